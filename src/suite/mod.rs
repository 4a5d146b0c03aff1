//! Claims as data, how each is measured, and what they come to.

pub mod checks;
pub mod claim;
pub mod stress;
#[expect(clippy::module_inception, reason = "the suite of the module suite is its main concept")]
pub mod suite;
pub mod verdict;

pub use claim::{Check, Claim, Evidence, Judged, LOOSENESS_MAX, Measurement, looseness};
pub use suite::{Scenes, Suite, summary};
pub use verdict::{Counts, Verdict};
