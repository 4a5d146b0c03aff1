//! `penetrode map`: how far Eq. 11-12 may be trusted, over (I, N).

use std::path::PathBuf;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::output::{
    check_outputs, is_standard, print_json, print_text, significant, table, table_lines, takes_standard_output,
    write_all,
};
use super::{CliError, Exit};
use crate::physics::Shown;
use crate::report::sweep_figures;
use crate::studies::applicability::{self, LEVELS, Line};
use crate::studies::experiments::{self, MarkedScene};

/// Arguments of `map`.
#[derive(Args, Debug)]
#[command(
    after_help = "The error is that of the depth of Eq. 11-12 against the equation of motion with finite N, exact \
    and not to first order. Above the N of a line the error is smaller. It vanishes at I = k pi/4 for every N.\n\n\
    Files: --out F.csv writes the lines as level,I,N and, beside it, the contour figure F.svg with the scenes of the \
    measured data marked."
)]
pub struct MapArgs {
    /// Crater depth in diameters.
    #[arg(long, default_value_t = 2.0, allow_hyphen_values = true)]
    pub k: f64,
    /// Write the lines to this CSV file and the figure beside it; - for standard output, without a figure.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `map --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MapJson {
    /// `penetrode/map/1`.
    pub schema: &'static str,
    /// Crater depth in diameters.
    pub k: f64,
    /// Lines of equal error.
    pub lines: Vec<Line>,
    /// Scenes of the measured data, each with its own k.
    pub scenes: Vec<MarkedScene>,
}

impl MapArgs {
    /// Computes the map, writes its files, and prints it.
    ///
    /// # Errors
    /// A k that is no number above zero (exit 2), a file that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        if !(self.k.is_finite() && self.k > 0.0) {
            return Err(CliError::usage(format!("--k {} is not allowed", Shown(self.k)), "give a number above zero"));
        }
        let is_table_printed = takes_standard_output(self.out.as_deref(), self.json)?;
        if let Some(path) = &self.out {
            check_outputs(&[], &[("the table", path), ("the figure", &path.with_extension("svg"))])?;
        }
        let scenes = experiments::marked(&experiments::shipped()?);
        let report = MapJson { schema: "penetrode/map/1", k: self.k, lines: applicability::lines(self.k), scenes };
        if let Some(path) = &self.out {
            let figure = sweep_figures::applicability(self.k, &report.lines, &report.scenes, &[]);
            let mut csv = vec!["level,I,N".to_owned()];
            for line in &report.lines {
                csv.extend(line.points.iter().map(|(i, n)| format!("{},{i},{n}", line.level)));
            }
            csv.push(String::new());
            let mut files = vec![(path.clone(), csv.join("\n").into_bytes())];
            if let Some(figure) = figure.filter(|_| !is_standard(path)) {
                files.push((path.with_extension("svg"), figure.file().into_bytes()));
            }
            write_all(&files)?;
        }
        if is_table_printed {
            return Ok(Exit::Success);
        }
        if self.json { print_json(&report) } else { print_text(&self.text(&report)) }.map_err(CliError::stdout)?;
        Ok(Exit::Success)
    }

    fn text(&self, report: &MapJson) -> String {
        let mut lines = vec![
            format!("Error of Eq. 11-12 against the equation of motion, k = {}", Shown(self.k)),
            "  least N for an error within".to_owned(),
        ];
        let mut rows = table(&["I", "1 %", "5 %", "20 %"]);
        for impact in [0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0] {
            let mut cells = vec![significant(impact)];
            cells.extend(
                LEVELS.map(|level| {
                    applicability::geometry_at(level, impact, self.k).map_or("any".to_owned(), significant)
                }),
            );
            rows.add_row(cells);
        }
        lines.extend(table_lines(&rows));
        lines.push(String::new());
        let mut sets = table(&["measured set", "tests", "I", "N", "error, %", "in 5 %"]);
        let mut names: Vec<&str> = report.scenes.iter().map(|scene| scene.set.as_str()).collect();
        names.dedup();
        for name in names {
            let of_set: Vec<_> = report.scenes.iter().filter(|scene| scene.set == name).collect();
            let range = |get: fn(&MarkedScene) -> f64| {
                of_set.iter().map(|s| get(s)).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
            };
            let (impact, geometry, error) = (range(|s| s.impact), range(|s| s.geometry), range(|s| s.error));
            let within = of_set.iter().filter(|s| s.error.abs() <= applicability::ERROR_ALLOWED).count();
            sets.add_row([
                (*name).to_owned(),
                of_set.len().to_string(),
                format!("{:.2} to {:.1}", impact.0, impact.1),
                format!("{:.1} to {:.1}", geometry.0, geometry.1),
                format!("{:+.1} to {:+.1}", 100.0 * error.0, 100.0 * error.1),
                within.to_string(),
            ]);
        }
        lines.extend(table_lines(&sets));
        lines.push(String::new());
        lines.join("\n")
    }
}
