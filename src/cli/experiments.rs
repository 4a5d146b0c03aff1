//! `penetrode experiments`: measured depths beside predicted ones, shipped or a user's own.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{
    check_outputs, escape_terminal, is_standard, print_json, print_text, significant, table, table_lines,
    takes_standard_output, wrapped, write_all,
};
use super::{CliError, Exit};
use crate::exchange::tables::{name_of, read_bytes};
use crate::report::sweep_figures;
use crate::studies::experiments::{self, Comparison, EXPERIMENTS, Experiment, SetSummary};
use crate::studies::sensitivity;

/// Arguments of `experiments`.
#[derive(Args, Debug)]
#[command(
    after_help = "Tables need the columns M_kg, d_mm, nose, CRH, fc_MPa, rho_kg_m3, V0_m_s, depth_mm in any order; \
    test_set groups the rows, depth_uncertainty_mm is the standard uncertainty of the depth where it is known, and other \
    columns are ignored. nose is flat, flat_assumed, ogive (CRH), hemispherical or spherical (CRH = radius/diameter).\n\n\
    S = 72 (fc/MPa)^-1/2, k = 0.707 + h/d, N* from the nose, semi-infinite target.\n\n\
    Files: --out F.csv writes a row for each test and, beside it, the figure F.svg with the band of +-20 %."
)]
pub struct ExperimentsArgs {
    /// Tables of measured tests; those that ship when left out.
    pub tables: Vec<PathBuf>,
    /// Crater depth in diameters for every test [default: 0.707 + h/d].
    #[arg(long, allow_hyphen_values = true)]
    pub k: Option<f64>,
    /// Relative standard deviation of an input, such as target.strength=5%; repeatable, for the input uncertainty.
    #[arg(long, value_name = "PATH=REL")]
    pub spread: Vec<String>,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write the comparison to this CSV file and the figure beside it; - for standard output, without a figure.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `experiments --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExperimentsJson<'a> {
    /// `penetrode/experiments/1`.
    pub schema: &'static str,
    /// Method of solution.
    pub method: MethodJson,
    /// Sets; experiments with X/d below 0.5 stand apart.
    pub sets: Vec<SetSummary>,
    /// Experiments in the order of the tables.
    #[serde(rename = "shots")]
    pub comparisons: &'a [Comparison],
    /// What the shipped data validate, and what not; `null` for a user's own.
    pub meaning: Option<&'static str>,
}

impl ExperimentsArgs {
    /// Compares, writes the files, and prints.
    ///
    /// # Errors
    /// Tables or options that cannot be used (exit 2), a file that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        let spreads = sensitivity::spreads(&self.spread)?;
        let is_table_printed = takes_standard_output(self.out.as_deref(), self.json)?;
        if let Some(path) = &self.out {
            let inputs: Vec<_> = self.tables.iter().map(|path| ("the measured table", path.as_path())).collect();
            check_outputs(&inputs, &[("the table", path), ("the figure", &path.with_extension("svg"))])?;
        }
        let experiments = self.experiments()?;
        let method = self.method.build()?;
        let comparisons = experiments::compare(&experiments, self.k, &spreads, method.integrator())?;
        let report = ExperimentsJson {
            schema: "penetrode/experiments/1",
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            sets: experiments::summaries(&comparisons),
            comparisons: &comparisons,
            meaning: self.tables.is_empty().then_some(experiments::MEANING),
        };
        if let Some(path) = &self.out {
            write_files(path, &comparisons)?;
        }
        if !is_table_printed {
            if self.json { print_json(&report) } else { print_text(&text(&report)) }.map_err(CliError::stdout)?;
        }
        Ok(Exit::Success)
    }

    fn experiments(&self) -> Result<Vec<Experiment>, CliError> {
        if self.tables.is_empty() {
            return Ok(experiments::shipped()?);
        }
        let mut all = Vec::new();
        for path in &self.tables {
            let set = path.file_stem().map_or_else(|| "own".to_owned(), |stem| stem.to_string_lossy().into_owned());
            all.extend(experiments::read(&name_of(path), &read_bytes(path, &EXPERIMENTS)?, &set)?);
        }
        Ok(all)
    }
}

/// The table and the figure. Both are made before the first is written.
fn write_files(path: &Path, comparisons: &[Comparison]) -> Result<(), CliError> {
    let figure = sweep_figures::measured_depths(comparisons, &[]);
    let csv = sweep_figures::measured_table(comparisons).to_csv();
    let mut files = vec![(path.to_owned(), csv.map_err(|error| CliError::write(path, std::io::Error::other(error)))?)];
    if let Some(figure) = figure.filter(|_| !is_standard(path)) {
        files.push((path.with_extension("svg"), figure.file().into_bytes()));
    }
    write_all(&files)
}

fn text(report: &ExperimentsJson<'_>) -> String {
    let mut lines = vec![format!("Predicted over measured depth, method {}", report.method.name), String::new()];
    let mut ratios = table(&["set", "tests", "median", "spread", "range", "within 20 %"]);
    let mut errors = table(&["set", "in range of S", "mean E/D", "u_val/D"]);
    for set in &report.sets {
        let name = escape_terminal(&set.group);
        ratios.add_row([
            name.clone(),
            set.experiments.to_string(),
            format!("{:.2}", set.median),
            format!("{:.2}", set.spread),
            format!("{:.2} to {:.2}", set.least, set.greatest),
            set.within_band.to_string(),
        ]);
        errors.add_row([
            name,
            set.in_range_of_fit.to_string(),
            format!("{:+.1} %", 100.0 * set.mean_error),
            set.validation_uncertainty.map_or("not given".to_owned(), |u| format!("{:.1} %", 100.0 * u)),
        ]);
    }
    lines.extend(table_lines(&ratios));
    lines.push(String::new());
    lines.extend(table_lines(&errors));
    lines.push(String::new());
    let given = |get: fn(&Comparison) -> Option<f64>| report.comparisons.iter().filter_map(get).count();
    let numerical = report.comparisons.iter().map(|c| c.numerical_uncertainty / c.predicted).fold(0.0, f64::max);
    let of_all = |count: usize, remedy: &str| match count {
        0 => format!("not given{remedy}"),
        n => format!("given for {n} of {} tests", report.comparisons.len()),
    };
    let named = [
        ("u_num, numerical", format!("{} of the depth at most", significant(numerical))),
        ("u_input, inputs", of_all(given(|c| c.input_uncertainty), " (--spread states one)")),
        ("u_D, data", of_all(given(|c| c.experiment.depth_uncertainty), " by the sources")),
    ];
    lines.push("  after ASME V&V 20: E = S - D, u_val² = u_num² + u_input² + u_D²".to_owned());
    lines.extend(named.map(|(name, value)| format!("  {name:<18} {value}")));
    if let Some(meaning) = report.meaning {
        lines.push(String::new());
        lines.push(wrapped("  ", meaning));
    }
    lines.push(String::new());
    lines.join("\n")
}
