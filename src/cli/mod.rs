//! The command line: one file per subcommand, exit codes in one place.

pub mod audit;
pub mod batch;
pub mod bench;
pub mod completions;
pub mod converge;
pub mod critical;
pub mod experiments;
pub mod input;
pub mod map;
pub mod method_args;
pub mod output;
pub mod scene_json;
pub mod schema;
pub mod sensitivities;
pub mod solve;
pub mod stress;
pub mod sweep;
pub mod verify;

use std::io;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use serde::Serialize;

use crate::integrators::IntegrationError;
use crate::physics::State;
use crate::physics::{Problem, ResolveError, Scene, SceneError};
use crate::report::folder::without_temporary_name;
use crate::studies::convergence::ConvergenceError;
use crate::studies::critical_velocity::CriticalError;

/// How the program ended (contract, "Exit codes").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All is well.
    Success = 0,
    /// The run failed.
    Failed = 1,
    /// Usage or input.
    Usage = 2,
    /// A criterion failed.
    Criterion = 3,
    /// Undecided.
    Undecided = 4,
    /// A required peer program is missing.
    PeerMissing = 5,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// What a subcommand can fail with, each with its exit code.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// A scene that cannot be used: exit 2.
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    /// A request that cannot be served: exit 2.
    #[error("{message}")]
    Usage {
        /// What is wrong.
        message: String,
        /// What to do.
        help: String,
    },
    /// A computation without an answer: exit 1.
    #[error("{message}")]
    Run {
        /// What happened.
        message: String,
        /// What to try.
        help: String,
        /// State reached, where there is one.
        last: Option<State>,
    },
    /// An answer inside its own error bar: exit 4.
    #[error("{message}")]
    Undecided {
        /// What cannot be told.
        message: String,
        /// What to try.
        help: String,
    },
    /// A result that could not be written: exit 1.
    #[error("cannot write {path}: {cause}")]
    Write {
        /// Where to.
        path: String,
        /// What the system said.
        cause: io::Error,
    },
    /// A peer that could not be started: exit 5.
    #[error("{0}")]
    PeerMissing(String),
}

impl From<IntegrationError> for CliError {
    fn from(error: IntegrationError) -> Self {
        let (message, help) = (error.to_string(), error.help().to_owned());
        if error.is_usage() { Self::Usage { message, help } } else { Self::Run { message, help, last: error.last() } }
    }
}

impl From<ResolveError> for CliError {
    fn from(error: ResolveError) -> Self {
        let (message, help) = (error.to_string(), error.help().to_owned());
        if error.is_usage() { Self::Usage { message, help } } else { Self::Run { message, help, last: None } }
    }
}

impl<E: std::fmt::Display> From<CriticalError<E>> for CliError {
    fn from(error: CriticalError<E>) -> Self {
        let message = error.to_string();
        let (help, last) = match &error {
            CriticalError::Flight { cause, .. } => (cause.help().to_owned(), cause.last()),
            CriticalError::Undecided { .. } => {
                let help =
                    "--method taylor or energy, or a tighter --rtol, resolves more of what is left of V0²".to_owned();
                return Self::Undecided { message, help };
            }
            CriticalError::NoBracket { .. } => (
                "drag takes all speed over the thickness: check the thickness, the density and the mass; with a fixed \
                 step, shorten --dt"
                    .to_owned(),
                None,
            ),
            _ => (String::new(), None),
        };
        if error.is_usage() { Self::Usage { message, help } } else { Self::Run { message, help, last } }
    }
}

impl From<ConvergenceError> for CliError {
    fn from(error: ConvergenceError) -> Self {
        match error {
            ConvergenceError::Resolve(error) => error.into(),
            ConvergenceError::Integration(error) => error.into(),
            ConvergenceError::Critical(error) => error.into(),
        }
    }
}

impl CliError {
    /// A mistake in the request.
    pub fn usage(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Usage { message: message.into(), help: help.into() }
    }

    /// A file that could not be written.
    pub fn write(path: &std::path::Path, cause: io::Error) -> Self {
        Self::Write { path: path.display().to_string(), cause: without_temporary_name(cause) }
    }

    /// Standard output that could not be written.
    pub fn stdout(cause: io::Error) -> Self {
        Self::Write { path: "standard output".to_owned(), cause }
    }

    /// The same about the file at `path`, where it is about what the file holds.
    #[must_use]
    pub fn in_file(self, path: &str) -> Self {
        let named = |message: String| match path {
            "-" => format!("standard input: {message}"),
            path => format!("{path}: {message}"),
        };
        match self {
            Self::Usage { message, help } => Self::Usage { message: named(message), help },
            Self::Run { message, help, last } => Self::Run { message: named(message), help, last },
            Self::Undecided { message, help } => Self::Undecided { message: named(message), help },
            other => other,
        }
    }

    /// The exit code.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Scene(_) | Self::Usage { .. } => Exit::Usage,
            Self::Run { .. } | Self::Write { .. } => Exit::Failed,
            Self::Undecided { .. } => Exit::Undecided,
            Self::PeerMissing(_) => Exit::PeerMissing,
        }
    }

    /// The message for a person, on standard error.
    pub fn render(&self, color: bool) -> String {
        match self {
            Self::Scene(error) => error.render(color),
            Self::Usage { message, help } | Self::Run { message, help, .. } | Self::Undecided { message, help } => {
                told(message, help)
            }
            Self::Write { cause, .. } => told(&self.to_string(), output::write_help(cause.kind())),
            Self::PeerMissing(message) => told(message, ""),
        }
    }
}

/// A message and what to do, for a terminal.
fn told(message: &str, help: &str) -> String {
    let mut text = output::wrapped("error: ", &output::escape_terminal(message));
    text.push('\n');
    if !help.is_empty() {
        text.push_str(&output::wrapped(" help: ", &output::escape_terminal(help)));
        text.push('\n');
    }
    text
}

/// The JSON verdict of a run that failed (exit 1) or could not decide (exit 4).
#[derive(Serialize)]
struct FailureJson {
    schema: String,
    error: ErrorJson,
}

#[derive(Serialize)]
struct ErrorJson {
    message: String,
    time_s: Option<f64>,
    depth_m: Option<f64>,
    velocity_m_s: Option<f64>,
}

/// penetrode: verify integrators of the equation of motion of a rigid projectile in concrete.
///
/// M dV/dt = -F(x, V); F = c x in the crater, P + Q V² in the tunnel, until rest or the far side. Every method's
/// answer stands beside the exact one.
#[derive(Parser, Debug)]
#[command(name = "penetrode", version, max_term_width = 80, arg_required_else_help = true, after_help = EXIT_HELP)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_HELP: &str = "Exit codes: 0 all is well, 1 the run failed, 2 usage or input, 3 a criterion failed, \
                         4 undecided, 5 a required peer program is missing.";

/// The subcommands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// One flight: depth, times and velocities, beside the exact answer.
    Solve(solve::SolveArgs),
    /// Critical velocity V_c and energy E_c by argmin, closed form and Eq. 15 beside them.
    Critical(critical::CriticalArgs),
    /// Many scenes from a table, one line of results each.
    Batch(batch::BatchArgs),
    /// Order of convergence of every quantity, fitted and classified.
    Converge(converge::ConvergeArgs),
    /// V_c, E_c/(d³ fc), depth and Eq. 15 along one number of a scene, or over two.
    Sweep(sweep::SweepArgs),
    /// How far Eq. 11-12 may be trusted: lines of equal error over (I, N).
    Map(map::MapArgs),
    /// What an accuracy costs: time and work against error, and the largest steps.
    Bench(bench::BenchArgs),
    /// Measured penetration depths beside predicted ones: shipped data or your own.
    Experiments(experiments::ExperimentsArgs),
    /// Order, error band and verdict for step-size results of another code.
    Audit(audit::AuditArgs),
    /// The verification suite and its report.
    Verify(verify::VerifyArgs),
    /// Numerical stability and event stress cases, and random scenes by the million.
    Stress(stress::StressArgs),
    /// JSON schema of what a command prints.
    Schema(schema::SchemaArgs),
    /// Shell completion.
    Completions(completions::CompletionsArgs),
}

impl Command {
    fn name(&self) -> &'static str {
        match self {
            Self::Solve(_) => "solve",
            Self::Critical(_) => "critical",
            Self::Batch(_) => "batch",
            Self::Converge(_) => "converge",
            Self::Sweep(_) => "sweep",
            Self::Map(_) => "map",
            Self::Bench(_) => "bench",
            Self::Experiments(_) => "experiments",
            Self::Audit(_) => "audit",
            Self::Verify(_) => "verify",
            Self::Stress(_) => "stress",
            Self::Schema(_) => "schema",
            Self::Completions(_) => "completions",
        }
    }

    fn wants_json(&self) -> bool {
        match self {
            Self::Solve(args) => args.json,
            Self::Critical(args) => args.json,
            Self::Converge(args) => args.json,
            Self::Sweep(args) => args.json,
            Self::Map(args) => args.json,
            Self::Bench(args) => args.json,
            Self::Experiments(args) => args.json,
            Self::Audit(args) => args.json,
            Self::Verify(args) => args.json,
            Self::Stress(args) => args.json,
            _ => false,
        }
    }

    fn run(&self) -> Result<Exit, CliError> {
        match self {
            Self::Solve(args) => args.run(),
            Self::Critical(args) => args.run(),
            Self::Batch(args) => args.run(),
            Self::Converge(args) => args.run(),
            Self::Sweep(args) => args.run(),
            Self::Map(args) => args.run(),
            Self::Bench(args) => args.run(),
            Self::Experiments(args) => args.run(),
            Self::Audit(args) => args.run(),
            Self::Verify(args) => args.run(),
            Self::Stress(args) => args.run(),
            Self::Schema(args) => args.run(),
            Self::Completions(args) => args.run(),
        }
    }
}

impl Cli {
    /// Runs the command, reports an error on standard error, and says how it ended.
    pub fn run(&self) -> Exit {
        match self.command.run() {
            Ok(exit) => exit,
            Err(error) => {
                if matches!(error.exit(), Exit::Failed | Exit::Undecided) && self.command.wants_json() {
                    let last = match &error {
                        CliError::Run { last, .. } => *last,
                        _ => None,
                    };
                    let failure = FailureJson {
                        schema: format!("penetrode/{}/1", self.command.name()),
                        error: ErrorJson {
                            message: error.to_string(),
                            time_s: last.map(|s| s.time),
                            depth_m: last.map(|s| s.depth),
                            velocity_m_s: last.map(|s| s.velocity),
                        },
                    };
                    // The message below still reaches the person if standard output is gone.
                    let _ = output::print_json(&failure);
                }
                output::tell_line(error.render(is_terminal_stderr()).trim_end_matches('\n'));
                error.exit()
            }
        }
    }
}

/// The scene in the file at `path`; `-` is standard input.
fn read_scene(path: &str) -> Result<Scene, Box<SceneError>> {
    Scene::read(std::path::Path::new(path))
}

/// The problem of `scene`, read from `path`; what is wrong with it names the file.
fn problem_of(scene: &Scene, path: &str) -> Result<Problem, CliError> {
    scene.problem().map_err(|error| CliError::from(error).in_file(path))
}

/// Whether standard error is a terminal that wants colour.
fn is_terminal_stderr() -> bool {
    use std::io::IsTerminal;
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none()
}
