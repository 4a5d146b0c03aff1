//! The equation of motion, what a scene says about it, and what is known of it exactly.

pub mod closed_form;
pub mod event;
pub mod exit_energy;
pub mod reference;
pub mod scalar;
pub mod scene;
pub mod stage;

pub use event::{Event, EventKind, Outcome, State};
pub use scalar::Scalar;
pub use scene::{Concrete, CraterStiffness, Criterion, Layer, Resistance, Scene};
pub use stage::{Problem, Stage, Stages, Target};
