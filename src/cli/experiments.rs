//! `penetrode experiments`: measured depths beside predicted ones, shipped or a user's own.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, check_table, write_table};
use super::{Answer, Ask, CliError, Exit};
use crate::exchange::input::name_of;
use crate::exchange::tables::read_bytes;
use crate::report::{cells, sweep_figures};
use crate::studies::experiments::{self, Comparison, EXPERIMENTS, Experiment, SetSummary};
use crate::studies::sensitivity;

/// Arguments of `experiments`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/experiments.txt"))]
pub struct ExperimentsArgs {
    /// Tables of measured tests; those that ship when left out.
    pub tables: Vec<PathBuf>,
    /// Crater depth in diameters [default: 0.707 + h/d].
    #[arg(long, allow_hyphen_values = true)]
    pub k: Option<f64>,
    /// Uncertainty for target.strength=5%; repeatable.
    ///
    /// Each gives the relative standard deviation of a number of the tests.
    #[arg(long, value_name = "PATH=REL")]
    pub spread: Vec<String>,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write this CSV file and a figure beside it.
    ///
    /// - is standard output, without a figure.
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
        let ratios = cells::sets(&self.sets).map(|row| row.into_iter().take(6).collect::<Vec<_>>());
        text.table(&cells::SETS[..6], ratios);
        text.gap();
        let [set, .., in_range, error, uncertainty] = cells::SETS;
        let errors = cells::sets(&self.sets).map(|[set, .., in_range, error, u]| [set, in_range, error, u]);
        text.table(&[set, in_range, error, uncertainty], errors);
        text.gap();
        text.line("  after ASME V&V 20: E = S - D, u_val² = u_num² + u_input² + u_D²");
        text.lines(cells::uncertainties(&self.comparisons).map(|(name, known)| format!("  {name:<18} {known}")));
        if let Some(meaning) = self.meaning {
            text.gap();
            text.wrapped("  ", meaning);
        }
        text.finish()
    }
}
