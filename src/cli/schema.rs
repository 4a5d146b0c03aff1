//! `penetrode schema COMMAND`: the JSON schema of what a command prints.

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::{CliError, Command, Exit, Run, output};

/// Arguments of `schema`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode schema solve > solve.schema.json\n\n\
    The JSON of bench, stress and verify is also the report.json of their folders.")]
pub struct SchemaArgs {
    /// The command whose JSON is described.
    #[arg(value_parser = PossibleValuesParser::new(Command::schemas().map(|(name, _)| PossibleValue::new(name))))]
    pub command: String,
}

impl Run for SchemaArgs {
    fn run(&self) -> Result<Exit, CliError> {
        for (_, schema) in Command::schemas().filter(|(name, _)| *name == self.command) {
            output::print_json(&schema()).map_err(CliError::stdout)?;
        }
        Ok(Exit::Success)
    }
}
