//! How a run of the suite or of the stress cases is shown: JSON, and a folder with a page, figures and tables.

mod applications;
pub mod bench;
pub mod chart;
pub mod environment;
pub mod families;
pub mod figure;
pub mod figure_data;
pub mod figures;
pub mod folder;
pub mod json;
pub mod junit;
pub mod page;
pub mod stability_figures;
pub mod stress;
mod stress_page;
pub mod summary;
pub mod sweep_figures;
pub mod table;
pub mod text;

pub use environment::Environment;
pub use json::VerifyJson;

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
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on should stop")]
mod tests;
