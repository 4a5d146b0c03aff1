//! Studies over many flights: orders of convergence, critical velocity, cost.

pub mod formal_order;
pub mod quantity;

pub use formal_order::{Path, Stretch, formal_order};
pub use quantity::Quantity;
//! Studies over many flights: order of convergence, grid convergence, and the judgement of other codes' results.

pub mod audit;
pub mod grid_convergence;
pub mod order;
pub mod quantity;
//! Questions asked of many flights: what an integrator's answers say together.

pub mod critical_velocity;
//! Questions that take more than one flight: orders, critical velocities, other people's programs.

pub mod peers;
