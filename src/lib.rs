//! Verification engine for the equation of motion of a rigid projectile in concrete.
//!
//! ```text
//! M dV/dt = -F(x, V),  dx/dt = V,  x(0) = 0,  V(0) = V0
//! crater  0 <= x < k d :  F = c x                 (Eq. 4)
//! tunnel  k d <= x     :  F = P + Q V²            (Eq. 5)
//! ```

#[macro_use]
mod fault;

pub mod cli;
pub mod integrators;
pub mod physics;
pub mod report;
pub mod studies;
pub mod suite;

#[cfg(feature = "faults")]
#[doc(hidden)]
pub use fault::{FAULTS, Fault, Seeded};
