//! Where the report of a study goes: `--out DIR` of `converge`, `audit` and `diagnose`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::verify::report_line;
use super::{CliError, command_typed};
use crate::exchange::input::is_standard;
use crate::report::study::StudyReport;
use crate::report::{Environment, folder};

/// Where the report of a study goes.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Write a report to this folder: a page, figures, tables for LaTeX and as CSV, JSON, JUnit.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

impl ReportArgs {
    /// Refuses a folder that cannot take the report of `command`, or holds one of `inputs`, before any work is done.
    ///
    /// # Errors
    /// As [`folder::check`]; a folder with an input in it (exit 2).
    pub fn check(&self, command: &str, inputs: &[&Path]) -> Result<(), CliError> {
        let Some(out) = &self.out else { return Ok(()) };
        folder::check(out, command)?;
        if let Ok(place) = out.canonicalize() {
            let is_inside = |input: &&&Path| {
                !is_standard(input) && input.canonicalize().is_ok_and(|input| input.starts_with(&place))
            };
            if let Some(input) = inputs.iter().find(is_inside) {
                let message = format!("the report would replace {}, which lies in {}", input.display(), out.display());
                return Err(CliError::usage(message, "name another folder with --out"));
            }
        }
        Ok(())
    }

    /// Writes the report that `report` makes of program, machine and command, where one is asked for; returns the line that
    /// says where it is, or nothing.
    ///
    /// # Errors
    /// As [`folder::write`].
    pub fn write(
        &self,
        numbers: &impl Serialize,
        report: impl FnOnce(Environment) -> StudyReport,
    ) -> Result<String, CliError> {
        let Some(out) = &self.out else { return Ok(String::new()) };
        // What goes in is named by the report itself.
        let environment = Environment::of_scenes(0, command_typed(), "", Vec::new());
        folder::write(report(environment).files(numbers), out)?;
        Ok(report_line(out) + "\n")
    }
}
