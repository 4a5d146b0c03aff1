//! The equation of motion, what a scene says about it, and what is known of it exactly.

pub mod advice;
pub mod ball;
pub mod closed_form;
pub mod condition;
pub mod decimals;
pub mod elementary;
pub mod exit_energy;
pub mod expression;
pub mod force_table;
pub mod groups;
pub(crate) mod lanes;
pub mod law;
pub mod nose;
pub mod parameter;
pub mod plug;
pub mod problem;
pub mod reference;
pub mod scalar;
pub mod scene;
pub mod semi_empirical;
pub mod units;

pub use crate::text::Shown;
pub use advice::Advice;
pub use condition::Condition;
pub use force_table::{ForceTable, SpeedTable};
pub use law::{ForceFunction, Law, Laws};
pub use parameter::Parameter;
pub use plug::Plug;
pub use problem::{Event, EventKind, Outcome, Problem, Stage, Stages, State, Target};
pub use scalar::Scalar;
pub use scene::{Concrete, CraterStiffness, Criterion, Force, Layer, Range, Resistance, ResolveError, Resolved, Scene};
