//! Studies over many flights: orders of convergence, critical velocity, cost.

pub mod formal_order;
pub mod quantity;

pub use formal_order::{Path, Stretch, formal_order};
pub use quantity::Quantity;
