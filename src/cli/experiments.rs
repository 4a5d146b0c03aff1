//! `penetrode experiments`: measured depths beside predicted ones, shipped or a user's own.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, check_table, escape_terminal, significant, write_table};
use super::{Answer, Ask, CliError, Exit};
use crate::exchange::input::name_of;
use crate::exchange::tables::read_bytes;
use crate::report::sweep_figures;
use crate::studies::experiments::{self, Comparison, EXPERIMENTS, Experiment, SetSummary};
use crate::studies::sensitivity;

/// Arguments of `experiments`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/experiments.txt"))]
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
}

/// What `experiments --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExperimentsJson {
    /// `penetrode/experiments/1`.
    pub schema: &'static str,
    /// Method of solution.
    pub method: MethodJson,
    /// Sets; experiments with X/d below 0.5 stand apart.
    pub sets: Vec<SetSummary>,
    /// Experiments in the order of the tables.
    #[serde(rename = "shots")]
    pub comparisons: Vec<Comparison>,
    /// What the shipped data validate, and what not; `null` for a user's own.
    pub meaning: Option<&'static str>,
}

impl Ask for ExperimentsArgs {
    type Answer = ExperimentsJson;

    fn table(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn ask(&self) -> Result<Answer<ExperimentsJson>, CliError> {
        let spreads = sensitivity::spreads(&self.spread)?;
        let inputs: Vec<_> = self.tables.iter().map(|path| ("the measured table", path.as_path())).collect();
        check_table(&inputs, self.table(), &[""])?;
        let experiments = self.experiments()?;
        let method = self.method.build()?;
        let comparisons = experiments::compare(&experiments, self.k, &spreads, method.integrator())?;
        if let Some(path) = &self.out {
            let figure = sweep_figures::measured_depths(&comparisons, &[]);
            write_table(path, Ok(sweep_figures::measured_table(&comparisons).into_bytes()), &[""], [figure])?;
        }
        let data = ExperimentsJson {
            schema: "penetrode/experiments/1",
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            sets: experiments::summaries(&comparisons),
            comparisons,
            meaning: self.tables.is_empty().then_some(experiments::MEANING),
        };
        Ok(Answer { text: data.text(), data: Some(data), exit: Exit::Success })
    }
}

impl ExperimentsArgs {
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

impl ExperimentsJson {
    fn text(&self) -> String {
        let mut text = Text::default();
        text.line(format!("Predicted over measured depth, method {}", self.method.name));
        text.gap();
        let ratios = self.sets.iter().map(|set| {
            [
                escape_terminal(&set.group),
                set.experiments.to_string(),
                format!("{:.2}", set.median),
                format!("{:.2}", set.spread),
                format!("{:.2} to {:.2}", set.least, set.greatest),
                set.within_band.to_string(),
            ]
        });
        text.table(&["set", "tests", "median", "spread", "range", "within 20 %"], ratios);
        text.gap();
        let errors = self.sets.iter().map(|set| {
            [
                escape_terminal(&set.group),
                set.in_range_of_fit.to_string(),
                format!("{:+.1} %", 100.0 * set.mean_error),
                set.validation_uncertainty.map_or("not given".to_owned(), |u| format!("{:.1} %", 100.0 * u)),
            ]
        });
        text.table(&["set", "in range of S", "mean E/D", "u_val/D"], errors);
        text.gap();
        let given = |get: fn(&Comparison) -> Option<f64>, remedy| match self.comparisons.iter().filter_map(get).count()
        {
            0 => format!("not given{remedy}"),
            count => format!("given for {count} of {} tests", self.comparisons.len()),
        };
        let numerical = self.comparisons.iter().map(|c| c.numerical_uncertainty / c.predicted).fold(0.0, f64::max);
        text.line("  after ASME V&V 20: E = S - D, u_val² = u_num² + u_input² + u_D²");
        text.line(format!("  u_num, numerical   {} of the depth at most", significant(numerical)));
        text.line(format!("  u_input, inputs    {}", given(|c| c.input_uncertainty, " (--spread states one)")));
        text.line(format!("  u_D, data          {}", given(|c| c.experiment.depth_uncertainty, " by the sources")));
        if let Some(meaning) = self.meaning {
            text.gap();
            text.wrapped("  ", meaning);
        }
        text.finish()
    }
}
