//! Claims as data, how each is measured, and their verdicts.

pub mod checks;
pub mod claim;
pub mod faults;
pub mod program;
pub mod recorded;
pub mod roads;
#[expect(clippy::module_inception, reason = "the suite of the module suite is its main concept")]
pub mod suite;
pub mod transcript;
pub mod verdict;

pub use crate::studies::experiments::grouped;
pub use checks::Check;
pub use claim::{
    Claim, Evidence, Judged, LOOSENESS_MAX, Measurement, Section, looseness, of_cases, skipped, tables, worst,
};
pub use faults::{SeededFault, seeded_faults};
pub use program::Program;
pub use suite::{Inputs, Scenes, Suite};
pub use verdict::{Counts, Verdict};
