//! The equation of motion, what a scene says about it, and what is known of it exactly.

pub mod closed_form;
pub mod event;
pub mod exit_energy;
pub mod groups;
pub mod nose;
pub mod number;
pub mod reference;
pub mod scalar;
pub mod scene;
pub mod scene_file;
pub mod semi_empirical;
pub mod stage;
pub mod units;

pub use event::{Event, EventKind, Outcome, State};
pub use number::Shown;
pub use scalar::Scalar;
pub use scene::{Concrete, CraterStiffness, Criterion, Layer, Range, Resistance, ResolveError, Scene};
pub use scene_file::SceneError;
pub use stage::{Problem, Stage, Stages, Target};
