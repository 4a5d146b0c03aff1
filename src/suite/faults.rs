//! Do the claims notice a wrong program? Faults that were built into copies of it, and the claims that noticed.

use serde::Deserialize;

/// A fault that was built into a copy of the program, alone, and who noticed it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeededFault {
    /// Its name in `tests/faults.toml`.
    pub id: String,
    /// What is wrong, one clause.
    pub what: String,
    /// Source file that holds it.
    pub file: String,
    /// The quickest tables of claims that notice it, at most five; `verify` or `stress` where that command gave no report.
    pub noticed_by: Vec<String>,
}

impl SeededFault {
    /// Whether no more than one table of claims notices it.
    pub fn is_thin(&self) -> bool {
        self.noticed_by.len() < 2
    }
}

#[derive(Deserialize)]
struct Record {
    fault: Vec<SeededFault>,
}

/// The faults of `tests/faults.toml`, as `tests/seeded_faults.rs` recorded what notices them.
///
/// # Errors
/// Only if the shipped record is broken, which a test excludes.
pub fn seeded_faults() -> Result<Vec<SeededFault>, toml::de::Error> {
    toml::from_str::<Record>(include_str!("../../verification/seeded_faults.toml")).map(|record| record.fault)
}
