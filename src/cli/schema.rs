//! `penetrode schema COMMAND`: the JSON schema of what a command prints.

use clap::{Args, ValueEnum};
use schemars::schema_for;

use super::{CliError, Exit, converge, critical, experiments, map, output, solve, sweep};
use crate::report::VerifyJson;
use crate::report::bench::BenchJson;
use crate::report::stress::StressJson;
use crate::studies::audit::Audit;

/// Arguments of `schema`.
#[derive(Args, Debug)]
pub struct SchemaArgs {
    /// The command whose JSON is described.
    #[arg(value_enum)]
    pub command: Documented,
}

/// Commands that print JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Documented {
    /// `solve --json`.
    Solve,
    /// `critical --json`.
    Critical,
    /// `converge --json`.
    Converge,
    /// `sweep --json`.
    Sweep,
    /// `map --json`.
    Map,
    /// `bench --json`, which is its `report.json`.
    Bench,
    /// `experiments --json`.
    Experiments,
    /// `audit --json`.
    Audit,
    /// `verify --json`, which is `report.json`.
    Verify,
    /// `stress --json`.
    Stress,
}

impl SchemaArgs {
    /// Prints the schema.
    ///
    /// # Errors
    /// When standard output cannot be written.
    pub fn run(&self) -> Result<Exit, CliError> {
        let schema = match self.command {
            Documented::Solve => schema_for!(solve::SolveJson),
            Documented::Critical => schema_for!(critical::CriticalJson),
            Documented::Converge => schema_for!(converge::ConvergeJson),
            Documented::Sweep => schema_for!(sweep::SweepJson),
            Documented::Bench => schema_for!(BenchJson),
            Documented::Experiments => schema_for!(experiments::ExperimentsJson),
            Documented::Map => schema_for!(map::MapJson),
            Documented::Audit => schema_for!(Audit),
            Documented::Verify => schema_for!(VerifyJson),
            Documented::Stress => schema_for!(StressJson),
        };
        output::print_json(&schema).map_err(CliError::stdout)?;
        Ok(Exit::Success)
    }
}
