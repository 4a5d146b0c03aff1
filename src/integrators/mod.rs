//! Methods that solve a problem, each returning the same [`Flight`].
//!
//! None branches on x inside the force of a stage: each integrates a stage as a smooth problem and restarts at its end.

#[cfg(feature = "diffsol")]
pub mod adaptive;
pub mod central_difference;
pub mod closed_form;
mod depth_integrals;
#[cfg(feature = "diffsol")]
pub mod diffsol;
#[cfg(feature = "diffsol")]
pub mod diffsol_sensitivity;
pub mod enclosure;
#[cfg(test)]
#[path = "tests/ends.rs"]
#[expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]
mod ends;
pub mod energy;
#[cfg(test)]
#[path = "tests/every_method.rs"]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test may stop at the first surprise")]
mod every_method;
mod flight;
mod gauss;
mod instructions;
pub mod lanes;
mod law_series;
#[cfg(test)]
#[path = "tests/laws.rs"]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test may stop at the first surprise")]
mod laws;
pub mod locate;
pub mod method;
pub mod outcome;
#[cfg(test)]
#[path = "tests/speed_tables.rs"]
#[expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]
mod speed_tables;
pub mod taylor;
mod velocity_integrals;

pub use central_difference::{Boundaries, CentralDifference, Steps, Summation, VelocityAt};
pub use closed_form::ClosedForm;
#[cfg(feature = "diffsol")]
pub use diffsol::{Diffsol, Scheme};
pub use enclosure::Enclosure;
pub use energy::Energy;
pub use method::{Accuracy, Method, MethodName, MethodOptions};
pub use outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Margin, Sample, Solved, StepLimit};
pub use taylor::Taylor;
