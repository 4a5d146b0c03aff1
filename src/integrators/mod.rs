//! Ways to fly a problem, each returning the same [`Flight`].
//!
//! None branches on x inside the force of a stage: each integrates a stage as a smooth problem and restarts at its end.

#[cfg(feature = "diffsol")]
pub mod adaptive;
#[cfg(feature = "diffsol")]
pub mod diffsol;
pub mod outcome;

#[cfg(feature = "diffsol")]
pub use adaptive::{Adaptive, Choice};
#[cfg(feature = "diffsol")]
pub use diffsol::{Diffsol, Scheme};
pub use outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Sample, StepLimit};
