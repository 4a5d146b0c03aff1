//! Ways to fly a problem, each returning the same [`Flight`].
//!
//! None branches on x inside the force of a stage: each integrates a stage as a smooth problem and restarts at its end.

pub mod locate;
pub mod outcome;
pub mod taylor;

pub use outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Sample, StepLimit};
pub use taylor::Taylor;
