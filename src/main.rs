//! The program: parse, run, exit code.

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    penetrode::cli::Cli::parse().run().into()
}
