//! What many flights show: orders of convergence, critical velocity, other people's programs and tables.

pub mod applicability;
pub mod asymptotic;
pub mod audit;
pub mod batch;
#[cfg(feature = "report")]
pub mod bench;
pub mod boxes;
pub mod convergence;
pub mod critical_velocity;
pub mod diagnosis;
pub mod edge_problems;
pub mod enclosure;
pub mod error;
pub mod experiments;
pub mod extreme_scenes;
pub mod formal_order;
pub mod formulas;
pub mod grid_convergence;
pub mod limit;
pub mod order;
pub mod perforating_velocities;
pub mod perforation_limit;
mod power_law;
pub mod quantity;
pub mod random;
pub mod random_problems;
pub mod random_scenes;
pub mod relations;
pub mod rounding;
pub mod scheme_of_table;
pub mod sensitivity;
pub mod stability;
pub mod sweep;
pub mod verdict;

pub use formal_order::{Path, Stretch, formal_order};
pub use quantity::Quantity;
pub use verdict::Verdict;
