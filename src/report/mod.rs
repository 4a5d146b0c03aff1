//! How a run of the suite or of the stress cases is shown: JSON, and a folder with a page, figures and tables.

pub mod bench;
pub mod cells;
pub mod chart;
mod coverage;
pub mod diagnosis;
pub mod environment;
pub mod figure;
pub mod figures;
pub mod flight_figure;
pub mod folder;
pub mod json;
pub mod junit;
mod latex;
mod nomenclature;
mod page;
pub mod references;
pub mod refinement;
pub mod stability_figures;
pub mod stress;
pub mod study;
pub mod summary;
pub mod sweep_figures;
mod typeset;
mod verify_page;
pub use crate::text;

pub use environment::Environment;
pub use json::{StressJson, VerifyJson};

use crate::studies::extreme_scenes::Summary;
use crate::suite::{Judged, Suite};

/// A finished run of a suite: everything that a report shows.
#[derive(Debug)]
pub struct Run<'a> {
    /// The suite.
    pub suite: &'a Suite,
    /// Its claims, judged, in the suite's order.
    pub judged: &'a [Judged],
    /// Where it ran and what remakes it.
    pub environment: Environment,
    /// A user's measured critical energies (H/d, `E_c/(d³ fc)`), shown with the paper's curve.
    pub points: &'a [(f64, f64)],
    /// What the random scenes of `stress` showed and the time spent on them (ms); `None` where none were asked for.
    pub random: Option<(&'a Summary, f64)>,
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on should stop")]
mod tests;
