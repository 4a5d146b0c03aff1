//! The command line: one file per command, one table of commands, one path of errors to their exit codes.

pub mod audit;
pub mod batch;
pub mod bench;
pub mod causes;
pub mod completions;
pub mod converge;
pub mod critical;
pub mod diagnose;
pub mod experiments;
pub mod export;
pub mod formulas;
pub mod init;
pub mod limit;
pub mod map;
pub mod method_args;
pub mod output;
pub mod report_args;
pub mod runs;
pub mod scene_json;
pub mod scenes;
pub mod schema;
pub mod sensitivities;
pub mod solve;
pub mod stress;
pub mod sweep;
pub mod verify;

use std::ffi::OsString;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use schemars::{JsonSchema, Schema, schema_for};
use serde::Serialize;
use serde_json::json;

use crate::exchange::SceneError;
use crate::exchange::input::{holding, is_standard, name_of};
use crate::exchange::interruption::clean_up_when_interrupted;
use crate::exchange::scene_file::SceneFile;
use crate::physics::{Advice, Problem, Scene, State};
use crate::report::folder::{FolderError, without_temporary_name};
use crate::suite::Verdict;

/// How the program ended (`docs/reference.md`, "Exit codes").
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

impl From<Verdict> for Exit {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Passed | Verdict::Skipped => Self::Success,
            Verdict::Failed => Self::Criterion,
            Verdict::Undecided => Self::Undecided,
        }
    }
}

/// Why a command has no answer.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// A scene that cannot be used, shown with the text underlined: exit 2.
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    /// A result that could not be written: exit 1.
    #[error("cannot write {path}: {cause}")]
    Write {
        /// Where to.
        path: String,
        /// What the system said.
        cause: io::Error,
    },
    /// Everything else.
    #[error("{message}")]
    Stated {
        /// Exit code.
        exit: Exit,
        /// What is wrong.
        message: String,
        /// What to do.
        help: String,
        /// State reached, where there is one.
        last: Option<State>,
    },
}

impl<E: Advice> From<E> for CliError {
    fn from(error: E) -> Self {
        let exit = match () {
            () if error.is_missing() => Exit::PeerMissing,
            () if error.is_undecided() => Exit::Undecided,
            () if error.is_usage() => Exit::Usage,
            () => Exit::Failed,
        };
        Self::Stated { exit, message: error.to_string(), help: error.help(), last: error.last() }
    }
}

impl From<FolderError> for CliError {
    fn from(error: FolderError) -> Self {
        match error {
            FolderError::NotOurs { .. } => {
                Self::usage(error.to_string(), "name another folder with --out, or move away what is there")
            }
            FolderError::Write { path, cause } => Self::Write { path, cause },
        }
    }
}

impl CliError {
    fn stated(exit: Exit, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Stated { exit, message: message.into(), help: help.into(), last: None }
    }

    /// A mistake in the request: exit 2.
    pub fn usage(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::stated(Exit::Usage, message, help)
    }

    /// A computation without an answer: exit 1.
    pub fn failed(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::stated(Exit::Failed, message, help)
    }

    /// A file that could not be written; `-` is standard output.
    pub fn write(path: &Path, cause: io::Error) -> Self {
        let path = if is_standard(path) { "standard output".to_owned() } else { path.display().to_string() };
        Self::Write { path, cause: without_temporary_name(cause) }
    }

    /// Standard output that could not be written.
    pub fn stdout(cause: io::Error) -> Self {
        Self::write(Path::new("-"), cause)
    }

    /// The same about the file at `path`, where it is about what the file holds.
    #[must_use]
    pub fn in_file(mut self, path: &str) -> Self {
        if let Self::Stated { message, .. } = &mut self {
            *message = format!("{}: {message}", name_of(Path::new(path)));
        }
        self
    }

    /// The exit code.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Scene(_) => Exit::Usage,
            Self::Write { .. } => Exit::Failed,
            Self::Stated { exit, .. } => *exit,
        }
    }

    /// The message for a person, on standard error.
    fn render(&self, color: bool) -> String {
        let help = match self {
            Self::Scene(error) => return error.render(color),
            Self::Write { cause, .. } => output::write_help(cause.kind()),
            Self::Stated { help, .. } => help,
        };
        let line = |head, text: &str| output::wrapped(head, &output::escape_terminal(text)) + "\n";
        let help = if help.is_empty() { String::new() } else { line(" help: ", help) };
        line("error: ", &self.to_string()) + &help
    }

    /// The JSON of a command that failed or could not decide.
    fn json(&self, command: &str) -> serde_json::Value {
        let last = if let Self::Stated { last, .. } = self { *last } else { None };
        json!({
            "schema": format!("penetrode/{command}/1"),
            "error": {
                "message": self.to_string(),
                "time_s": last.map(|s| s.time),
                "depth_m": last.map(|s| s.depth),
                "velocity_m_s": last.map(|s| s.velocity),
            },
        })
    }
}

/// A command, with its arguments.
pub trait Run {
    /// Does what the command is for.
    ///
    /// # Errors
    /// [`CliError`], with the exit code.
    fn run(&self) -> Result<Exit, CliError>;

    /// Its answer to a program that calls it: nothing is printed, files are written.
    ///
    /// # Errors
    /// As [`Run::run`]; a command without an answer (exit 2).
    fn call(&self) -> Result<Called, CliError> {
        Err(CliError::usage("the command has no answer in JSON", "run it in a shell"))
    }

    /// Whether JSON is asked for.
    fn wants_json(&self) -> bool {
        false
    }

    /// What makes the schema of that JSON, where the command has one.
    fn schema() -> Option<fn() -> Schema>
    where
        Self: Sized,
    {
        None
    }
}

/// A command with one answer, for people and as JSON.
pub trait Ask: Args {
    /// What `--json` prints.
    type Answer: Serialize + JsonSchema;

    /// The answer to these arguments; files are written.
    ///
    /// # Errors
    /// [`CliError`], with the exit code.
    fn ask(&self) -> Result<Answer<Self::Answer>, CliError>;

    /// The table that the command writes: on standard output (`-`) it takes the place of the answer.
    fn table(&self) -> Option<&Path> {
        None
    }
}

/// What a command found.
#[derive(Debug)]
pub struct Answer<T> {
    /// For programs; `None` where the answer is a text whoever asks.
    pub data: Option<T>,
    /// For people.
    pub text: String,
    /// Exit code.
    pub exit: Exit,
}

/// What a command answers a program that calls it.
#[derive(Clone, Debug)]
pub struct Called {
    /// What `--json` prints; `None` where the answer is a text whoever asks.
    pub json: Option<String>,
    /// What is printed for people.
    pub text: String,
    /// How the program would have ended.
    pub exit: Exit,
}

impl Called {
    /// Of `answer`.
    ///
    /// # Errors
    /// When there is no memory for the JSON.
    pub fn new<T: Serialize>(answer: Answer<T>) -> Result<Self, CliError> {
        let Answer { data, text, exit } = answer;
        let json = data.map(|data| serde_json::to_string(&data)).transpose();
        Ok(Self { json: json.map_err(|error| CliError::stdout(error.into()))?, text, exit })
    }
}

/// The answer to the `words` of a command line, the first of which is the command. Each of `files` stands in memory under its
/// name, wherever the command reads a small file whole (a scene, a table of steps).
///
/// The same function as the program's, for programs that link it: signals, standard output and standard error are left alone.
/// The texts beside the answer are the warnings and notes.
///
/// # Example
/// ```
/// use penetrode::cli::call;
///
/// let (answer, said) = call(&["critical", "tunnel", "--set", "target.thickness=0.3 m"].map(String::from), Vec::new());
/// assert!(answer?.json.is_some_and(|json| json.contains("critical_velocity_m_s")));
/// assert!(said.iter().all(|text| text.starts_with("warning: ")));
/// # Ok::<(), penetrode::cli::CliError>(())
/// ```
///
/// # Errors
/// [`CliError`], with the exit code.
pub fn call(words: &[String], files: Vec<(String, Vec<u8>)>) -> (Result<Called, CliError>, Vec<String>) {
    output::hearing(|| {
        let words = ["penetrode"].into_iter().chain(words.iter().map(String::as_str));
        let cli = Cli::try_parse_from(words).map_err(|error| {
            let text = error.render().to_string();
            // What follows tells how to ask for help in a shell.
            let text = text.split("\n\nUsage:").next().unwrap_or_default().split("\n\nFor more").next();
            let text = text.unwrap_or_default().trim().trim_start_matches("error: ");
            CliError::usage(text, "")
        })?;
        holding(files, || cli.command.entry().1.call())
    })
}

/// A command that prints its answer, as JSON if asked.
#[derive(Args, Debug)]
pub struct Printing<A: Args> {
    /// Its own arguments.
    #[command(flatten)]
    pub args: A,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

impl<A: Ask> Run for Printing<A> {
    fn run(&self) -> Result<Exit, CliError> {
        let is_table_printed = self.args.table().is_some_and(is_standard);
        if is_table_printed && self.json {
            let message = "the table and the JSON cannot both go to standard output";
            return Err(CliError::usage(message, "name a file for one"));
        }
        let answer = self.args.ask()?;
        match answer.data {
            _ if is_table_printed => Ok(()),
            Some(data) if self.json => output::print_json(&data),
            _ => output::print_text(&answer.text),
        }
        .map_err(CliError::stdout)?;
        Ok(answer.exit)
    }

    fn call(&self) -> Result<Called, CliError> {
        Called::new(self.args.ask()?)
    }

    fn wants_json(&self) -> bool {
        self.json
    }

    fn schema() -> Option<fn() -> Schema> {
        Some(|| schema_for!(A::Answer))
    }
}

/// The table of commands: description, variant, name, arguments.
macro_rules! commands {
    ($($(#[doc = $doc:literal])+ $variant:ident = $name:literal: $arguments:ty,)+) => {
        /// The commands.
        #[derive(Subcommand, Debug)]
        pub enum Command {
            $($(#[doc = $doc])+ #[command(name = $name)] $variant($arguments),)+
        }

        impl Command {
            /// Name, and what runs.
            fn entry(&self) -> (&'static str, &dyn Run) {
                match self {
                    $(Self::$variant(arguments) => ($name, arguments),)+
                }
            }

            /// Name of each command that prints JSON, and what makes its schema: only one is ever wanted.
            fn schemas() -> impl Iterator<Item = (&'static str, fn() -> Schema)> {
                [$(($name, <$arguments>::schema()),)+].into_iter().filter_map(|(name, schema)| Some((name, schema?)))
            }
        }
    };
}

commands! {
    /// A scene solved: depth, times, velocities, beside the exact answer.
    Solve = "solve": Printing<solve::SolveArgs>,
    /// Critical velocity and energy, beside the closed form and Eq. 15.
    Critical = "critical": Printing<critical::CriticalArgs>,
    /// The thickness that just stops the projectile, beside Eq. 11-12.
    Limit = "limit": Printing<limit::LimitArgs>,
    /// Depth, perforation and scabbing limits by published formulas.
    Formulas = "formulas": Printing<formulas::FormulasArgs>,
    /// Many scenes from a table, one line of results each.
    Batch = "batch": batch::BatchArgs,
    /// Order of convergence of every quantity, fitted and classified.
    Converge = "converge": Printing<converge::ConvergeArgs>,
    /// V_c, energy, depth and Eq. 15 along one number of a scene or two.
    Sweep = "sweep": Printing<sweep::SweepArgs>,
    /// How far Eq. 11-12 may be trusted: lines of equal error.
    Map = "map": Printing<map::MapArgs>,
    /// What an accuracy costs: time and work, and the largest steps.
    Bench = "bench": Printing<bench::BenchArgs>,
    /// Measured depths beside predicted ones: shipped data or your own.
    Experiments = "experiments": Printing<experiments::ExperimentsArgs>,
    /// A scene as what a finite element code runs: VDLOAD, decks, driver.
    Export = "export": Printing<export::ExportArgs>,
    /// Order, error bar and verdict for results of another code.
    Audit = "audit": Printing<audit::AuditArgs>,
    /// Is a solver right, and if not, what is wrong with it?
    Diagnose = "diagnose": Printing<diagnose::DiagnoseArgs>,
    /// The causes that a diagnosis may find, and what each does.
    Causes = "causes": Printing<causes::CausesArgs>,
    /// The verification suite and its report.
    Verify = "verify": Printing<verify::VerifyArgs>,
    /// Cases at the edges of numbers and events, and random scenes.
    Stress = "stress": Printing<stress::StressArgs>,
    /// The scenes that ship: one line each, or the file of one.
    Scenes = "scenes": Printing<scenes::ScenesArgs>,
    /// A file to begin with: a solver, a scene, a suite or data.
    Init = "init": init::InitArgs,
    /// JSON schema of what a command prints, or of a file it reads.
    Schema = "schema": schema::SchemaArgs,
    /// Shell completion.
    Completions = "completions": completions::CompletionsArgs,
}

/// penetrode: verify integrators of the equation of motion of a rigid projectile in concrete.
///
/// M dV/dt = -F(x, V); F = c x in the crater, P + Q V² in the tunnel, until rest or the far side. Every method's
/// answer stands beside the exact one.
#[derive(Parser, Debug)]
#[command(name = "penetrode", version, max_term_width = 80, arg_required_else_help = true, after_help = include_str!("help/penetrode.txt"))]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// No warnings and no progress on standard error.
    #[arg(long, global = true, display_order = 1000)]
    pub quiet: bool,
}

impl Cli {
    /// The arguments of this process; a mistake in them, and a wish for help, end it.
    pub fn of_process() -> Self {
        Self::of_words(std::env::args_os()).unwrap_or_else(|error| error.exit())
    }

    /// The `words` of a command line, the first of which names the program: those of this process, or of one that is run
    /// by another program, such as a script.
    ///
    /// # Errors
    /// A mistake in them, or a wish for help.
    pub fn of_words(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let words = WORDS.get_or_init(|| words.into_iter().collect());
        // What is cut off for `-h` alone would be missing nowhere else.
        let is_brief = words.iter().any(|word| word == "-h");
        let commands = if is_brief { brief(Self::command()).mut_subcommands(brief) } else { Self::command() };
        Self::from_arg_matches(&commands.try_get_matches_from(words)?)
    }

    /// Runs the command, reports an error on standard error, and says how it ended.
    pub fn run(&self) -> Exit {
        if self.quiet {
            output::be_quiet();
        }
        clean_up_when_interrupted();
        let (name, command) = self.command.entry();
        command.run().unwrap_or_else(|error| {
            if matches!(error.exit(), Exit::Failed | Exit::Undecided) && command.wants_json() {
                // The message below still reaches the person if standard output is gone.
                let _ = output::print_json(&error.json(name));
            }
            let color = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
            output::say_error(error.render(color).trim_end_matches('\n'));
            error.exit()
        })
    }
}

/// `command` with a help that fits a screen: an option without the list of its values, an example without what follows it.
fn brief(command: clap::Command) -> clap::Command {
    let has_list = |arg: &clap::Arg| arg.get_action().takes_values() && !arg.is_positional();
    let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let example = text.split("\n\n").next().unwrap_or_default().to_owned();
    let is_cut =
        example != text || command.get_arguments().any(|arg| has_list(arg) && !arg.get_possible_values().is_empty());
    let hidden = |arg: clap::Arg| if has_list(&arg) { arg.hide_possible_values(true) } else { arg };
    let command = command.mut_args(hidden).after_help(example);
    // It says then that there is more to see.
    if is_cut { command.after_long_help(text) } else { command }
}

/// The scene of a command.
#[derive(Args, Debug)]
pub struct SceneArgs {
    /// Scene file, name of a scene that ships, or - for standard input.
    #[arg(value_name = "SCENE")]
    pub path: String,
    /// What is set in the scene.
    #[command(flatten)]
    pub settings: Settings,
}

/// What is set in each scene of a command, as if its file gave it.
#[derive(Args, Debug)]
pub struct Settings {
    /// Set impact.velocity=400m/s and the like; repeatable.
    ///
    /// Any number or word of a scene file, as if the file gave it.
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,
}

impl Settings {
    /// The scene in the file at `path`, or of that name; `-` is standard input.
    fn read(&self, path: &str) -> Result<Scene, Box<SceneError>> {
        self.read_file(path).map(|file| file.scene)
    }

    /// As [`Settings::read`], with what was written for its numbers.
    fn read_file(&self, path: &str) -> Result<SceneFile, Box<SceneError>> {
        SceneFile::read(Path::new(path), &self.set)
    }

    /// The scene in the file at `path` and its problem; what is wrong with it names the file.
    fn read_problem(&self, path: &str) -> Result<(Scene, Problem), CliError> {
        self.read_file_and_problem(path).map(|(file, problem)| (file.scene, problem))
    }

    /// As [`Settings::read_problem`], with what was written for the numbers of the scene.
    fn read_file_and_problem(&self, path: &str) -> Result<(SceneFile, Problem), CliError> {
        let file = self.read_file(path)?;
        let problem = file.scene.problem().map_err(|error| CliError::from(error).in_file(path))?;
        Ok((file, problem))
    }
}

/// The command line of this run; empty where a program calls a command.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// The program, where it is not the one that this process runs.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// From now on the program is at `path`: for a process that is another program, such as an interpreter of scripts. What runs
/// the program anew, as claims about its commands do, runs that.
pub fn let_program_be(path: PathBuf) {
    // Said once: a second word changes nothing.
    let _ = PROGRAM.set(path);
}

/// The program that claims about commands run.
fn program() -> io::Result<PathBuf> {
    PROGRAM.get().cloned().map_or_else(std::env::current_exe, Ok)
}

/// The command of this run as it was typed, its words quoted as for a shell.
fn command_typed() -> String {
    let Some(words) = WORDS.get() else { return "called by another program".to_owned() };
    let words: Vec<_> = words.iter().skip(1).map(|word| word.to_string_lossy()).collect();
    // A NUL cannot be quoted, and cannot be in an argument either.
    format!("penetrode {}", shlex::try_join(words.iter().map(AsRef::as_ref)).unwrap_or_default())
}
