//! The program: parse, run, exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(penetrode::cli::Cli::of_process().run() as u8)
}
