//! `penetrode completions SHELL`: shell completion on standard output.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{Cli, CliError, Exit, Run, output};

/// Arguments of `completions`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode completions bash > ~/.local/share/bash-completion/completions/penetrode")]
pub struct CompletionsArgs {
    /// The shell.
    #[arg(value_enum)]
    pub shell: Shell,
}

impl Run for CompletionsArgs {
    fn run(&self) -> Result<Exit, CliError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "penetrode", &mut script);
        output::print_text(&String::from_utf8_lossy(&script)).map_err(CliError::stdout)?;
        Ok(Exit::Success)
    }
}
