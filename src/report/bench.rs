//! The report of `bench`: its JSON, and a folder with a page of its own.
//!
//! It is separate from the report of `verify`, whose numbers are the same in every run: times belong to one machine
//! and one hour, and decide no claim.

mod figures;
mod page;

use std::io;

use schemars::JsonSchema;
use serde::Serialize;

use super::environment::Environment;
use super::folder::{Files, files_of};
use crate::studies::bench::growth::Growth;
use crate::studies::bench::step_size::StepStudy;
use crate::studies::bench::work_precision::{Case, Fastest, Known, Run};

/// What `bench --json` prints, and `report.json` of its folder.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BenchJson {
    /// `penetrode/bench/1`.
    pub schema: &'static str,
    /// Cases, in the order of the report.
    pub scenes: Vec<CaseJson>,
    /// Every run, coarse to fine, wrong ones included.
    pub runs: Vec<Run>,
    /// Fastest run of each method within each error.
    pub fastest: Vec<Fastest>,
    /// The paper's scheme against its step.
    pub step_size: Vec<StepStudy>,
    /// Cost as work grows.
    pub growth: Vec<Growth>,
    /// Where it ran and what remakes it.
    pub environment: Environment,
}

/// A case.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CaseJson {
    /// Name, as in `runs`.
    pub name: String,
    /// Title of the scene.
    pub title: Option<String>,
    /// How many scenes it is.
    pub problems: usize,
    /// How many of them are measured by 50 digits; the others by a Taylor series to round-off.
    pub exact: usize,
}

impl From<&Case> for CaseJson {
    fn from(case: &Case) -> Self {
        Self {
            name: case.name.clone(),
            title: case.title.clone(),
            problems: case.problems.len(),
            exact: case.problems.iter().filter(|known| Known::is_exact(known)).count(),
        }
    }
}

/// Every file of the report.
///
/// # Errors
/// Only what makes memory run out.
pub fn files(report: &BenchJson) -> io::Result<Files> {
    let figures = figures::all(report);
    files_of(report, page::to_html(report, &figures), &figures)
}
