//! Studies over many flights: order of convergence, grid convergence, and the judgement of other codes' results.

pub mod audit;
pub mod grid_convergence;
pub mod order;
pub mod quantity;
