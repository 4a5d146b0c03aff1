//! `penetrode experiments`: measured depths beside predicted ones, shipped or a user's own.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::input::table_text;
use super::method_args::{MethodArgs, MethodJson};
use super::output::{
    check_outputs, escape_terminal, is_standard, print_json, print_text, significant, table, table_lines,
    takes_standard_output, wrapped, write_all,
};
use super::{CliError, Exit};
use crate::report::figure::Figure;
use crate::report::sweep_figures;
use crate::studies::experiments::{self, Comparison, PredictionCause, PredictionError, SetSummary, Shot};
use crate::studies::sensitivity::{self, SpreadError};

/// Arguments of `experiments`.
#[derive(Args, Debug)]
#[command(
    after_help = "Tables need the columns M_kg, d_mm, nose, CRH, fc_MPa, rho_kg_m3, V0_m_s, depth_mm in any order; \
    test_set groups the rows, depth_uncertainty_mm is the standard uncertainty of the depth where it is known, and other \
    columns are ignored. nose is flat, flat_assumed, ogive (CRH), hemispherical or spherical (CRH = radius/diameter).\n\n\
    S = 72 (fc/MPa)^-1/2, k = 0.707 + h/d, N* from the nose, semi-infinite target.\n\n\
    Files: --out F.csv writes a row a shot and, beside it, the figure F.svg with the band of +-20 %."
)]
pub struct ExperimentsArgs {
    /// Tables of shots; those that ship when left out.
    pub tables: Vec<PathBuf>,
    /// Crater depth in diameters for every shot [default: 0.707 + h/d].
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
pub struct ExperimentsJson {
    /// `penetrode/experiments/1`.
    pub schema: &'static str,
    /// Method of the flights.
    pub method: MethodJson,
    /// Sets; shots with X/d below 0.5 stand apart.
    pub sets: Vec<SetJson>,
    /// Shots in the order of the tables.
    pub shots: Vec<ShotJson>,
    /// What the shipped data validate, and what not; `null` for a user's own.
    pub meaning: Option<&'static str>,
}

/// A set.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "named as in the text")]
pub struct SetJson {
    pub set: String,
    pub shots: usize,
    /// Median of predicted over measured depth.
    pub median: f64,
    /// Standard deviation of predicted over measured depth.
    pub spread: f64,
    pub least: f64,
    pub greatest: f64,
    pub within_20_percent: usize,
    pub in_range_of_fit: usize,
    /// Mean of E/D, E = S - D (ASME V&V 20).
    pub mean_comparison_error: f64,
    /// Root mean square of u_val/D; `null`: not given.
    pub validation_uncertainty: Option<f64>,
}

/// A shot.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "named as in the text, with its unit")]
#[expect(non_snake_case, reason = "the groups are named as in the paper")]
pub struct ShotJson {
    pub set: String,
    pub line: u64,
    pub velocity_m_s: f64,
    pub measured_depth_m: f64,
    pub predicted_depth_m: f64,
    pub ratio: f64,
    pub I: f64,
    pub N: Option<f64>,
    pub k: f64,
    pub comparison_error_m: f64,
    pub numerical_uncertainty_m: f64,
    pub input_uncertainty_m: Option<f64>,
    pub data_uncertainty_m: Option<f64>,
    pub validation_uncertainty_m: Option<f64>,
}

impl From<&Comparison> for ShotJson {
    fn from(c: &Comparison) -> Self {
        Self {
            set: c.shot.set.clone(),
            line: c.shot.line,
            velocity_m_s: c.shot.velocity,
            measured_depth_m: c.shot.depth,
            predicted_depth_m: c.predicted,
            ratio: c.ratio(),
            I: c.impact,
            N: c.geometry,
            k: c.crater_ratio,
            comparison_error_m: c.comparison_error(),
            numerical_uncertainty_m: c.numerical_uncertainty,
            input_uncertainty_m: c.input_uncertainty,
            data_uncertainty_m: c.shot.depth_uncertainty,
            validation_uncertainty_m: c.validation_uncertainty(),
        }
    }
}

impl From<&SetSummary> for SetJson {
    fn from(s: &SetSummary) -> Self {
        Self {
            set: s.group.clone(),
            shots: s.shots,
            median: s.median,
            spread: s.spread,
            least: s.extremes.0,
            greatest: s.extremes.1,
            within_20_percent: s.within_band,
            in_range_of_fit: s.in_range_of_fit,
            mean_comparison_error: s.mean_error,
            validation_uncertainty: s.validation_uncertainty,
        }
    }
}

impl From<SpreadError> for CliError {
    fn from(error: SpreadError) -> Self {
        let help = match &error {
            SpreadError::Parameter(error) => error.help(),
            SpreadError::Twice(_) => "leave one of the two out".to_owned(),
            _ => "write for example --spread target.strength=5%".to_owned(),
        };
        Self::Usage { message: error.to_string(), help }
    }
}

impl From<PredictionError> for CliError {
    fn from(error: PredictionError) -> Self {
        let message = error.to_string();
        match error.cause {
            PredictionCause::Flight(cause) if !cause.is_usage() => {
                Self::Run { message, help: cause.help().to_owned(), last: cause.last() }
            }
            _ => Self::Usage { message, help: "check the numbers of that row".to_owned() },
        }
    }
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
        let shots = self.shots()?;
        let method = self.method.build()?;
        let comparisons = experiments::compare(&shots, self.k, &spreads, method.integrator())?;
        let summaries = experiments::summaries(&comparisons);
        let report = ExperimentsJson {
            schema: "penetrode/experiments/1",
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            sets: summaries.iter().map(SetJson::from).collect(),
            shots: comparisons.iter().map(ShotJson::from).collect(),
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

    fn shots(&self) -> Result<Vec<Shot>, CliError> {
        let help = "see `penetrode experiments --help` for the columns, which are separated by commas";
        if self.tables.is_empty() {
            return experiments::shipped().map_err(|error| CliError::usage(error.to_string(), help));
        }
        let mut shots = Vec::new();
        for path in &self.tables {
            let name = path.display();
            let text = table_text(path, help)?;
            let set = path.file_stem().map_or_else(|| "own".to_owned(), |stem| stem.to_string_lossy().into_owned());
            let read = experiments::read(&text, &set);
            shots.extend(read.map_err(|error| CliError::usage(format!("{name}: {error}"), help))?);
        }
        Ok(shots)
    }
}

/// The table and the figure; both are made before the first is written.
fn write_files(path: &Path, comparisons: &[Comparison]) -> Result<(), CliError> {
    let failed = |error| CliError::write(path, std::io::Error::other(error));
    let figure = sweep_figures::measured_depths(comparisons).map(Figure::draw).transpose().map_err(failed)?;
    let csv = sweep_figures::measured_table(comparisons).to_csv();
    let mut files = vec![(path.to_owned(), csv.map_err(|error| CliError::write(path, std::io::Error::other(error)))?)];
    if let Some(figure) = figure.filter(|_| !is_standard(path)) {
        files.push((path.with_extension("svg"), figure.file().into_bytes()));
    }
    write_all(&files)
}

fn text(report: &ExperimentsJson) -> String {
    let mut lines = vec![format!("Predicted over measured depth, method {}", report.method.name), String::new()];
    let mut ratios = table(&["set", "shots", "median", "spread", "range", "within 20 %"]);
    let mut errors = table(&["set", "in range of S", "mean E/D", "u_val/D"]);
    for set in &report.sets {
        let name = escape_terminal(&set.set);
        ratios.add_row([
            name.clone(),
            set.shots.to_string(),
            format!("{:.2}", set.median),
            format!("{:.2}", set.spread),
            format!("{:.2} to {:.2}", set.least, set.greatest),
            set.within_20_percent.to_string(),
        ]);
        errors.add_row([
            name,
            set.in_range_of_fit.to_string(),
            format!("{:+.1} %", 100.0 * set.mean_comparison_error),
            set.validation_uncertainty.map_or("not given".to_owned(), |u| format!("{:.1} %", 100.0 * u)),
        ]);
    }
    lines.extend(table_lines(&ratios));
    lines.push(String::new());
    lines.extend(table_lines(&errors));
    lines.push(String::new());
    let given = |get: fn(&ShotJson) -> Option<f64>| report.shots.iter().filter_map(get).count();
    let numerical = report.shots.iter().map(|s| s.numerical_uncertainty_m / s.predicted_depth_m).fold(0.0, f64::max);
    let of_all = |count: usize, remedy: &str| match count {
        0 => format!("not given{remedy}"),
        n => format!("given for {n} of {} shots", report.shots.len()),
    };
    let named = [
        ("u_num, numerical", format!("{} of the depth at most", significant(numerical))),
        ("u_input, inputs", of_all(given(|s| s.input_uncertainty_m), " (--spread states one)")),
        ("u_D, data", of_all(given(|s| s.data_uncertainty_m), " by the sources")),
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
