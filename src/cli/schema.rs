//! `penetrode schema WHAT`: the JSON schema of what a command prints, or of a file that it reads.

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::{CliError, Command, Exit, Run, output};
use crate::exchange::scene_file;
use crate::suite::Suite;

/// Arguments of `schema`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/schema.txt"))]
pub struct SchemaArgs {
    /// The command whose JSON is described, or `scene` or `suite`: the file.
    #[arg(value_parser = PossibleValuesParser::new(names()))]
    pub what: String,
}

/// What has a schema.
fn names() -> impl Iterator<Item = PossibleValue> {
    ["scene", "suite"].into_iter().chain(Command::schemas().map(|(name, _)| name)).map(PossibleValue::new)
}

impl Run for SchemaArgs {
    fn run(&self) -> Result<Exit, CliError> {
        match self.what.as_str() {
            "scene" => output::print_json(&scene_file::schema()),
            "suite" => output::print_json(&Suite::schema()),
            command => {
                let schema = Command::schemas().find(|(name, _)| *name == command);
                schema.map_or(Ok(()), |(_, schema)| output::print_json(&schema()))
            }
        }
        .map_err(CliError::stdout)?;
        Ok(Exit::Success)
    }
}
