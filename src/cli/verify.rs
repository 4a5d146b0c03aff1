//! `penetrode verify`: the verification suite and its report.

use std::path::PathBuf;
use std::sync::Mutex;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::output::{escape_terminal, print_json, print_text, tell, tell_line, wrapped};
use super::sweep::read_data;
use super::{CliError, Exit};
use crate::report::{Environment, Run, VerifyJson, folder};
use crate::studies::peers::{BundledPeer, Environment as PeerEnvironment, PeerStartError};
use crate::suite::checks::PeerAnswers;
use crate::suite::{Check, Counts, Judged, LOOSENESS_MAX, Suite, Verdict, looseness, summary};

/// Arguments of `verify`.
#[derive(Args, Debug)]
#[command(after_help = "The report shows the claims with their figures: orders, events, other programs, the paper's \
    curve, the range of Eq. 11-12, measured depths, layers, stability and rounding. The cases at the edges have a \
    report of their own: penetrode stress --out DIR.")]
pub struct VerifyArgs {
    /// Suite file (TOML) [default: the suite that ships].
    pub suite: Option<String>,
    /// Folder of the report.
    #[arg(long, value_name = "DIR", default_value = folder::DEFAULT)]
    pub out: PathBuf,
    /// Only claims whose id contains this.
    #[arg(long, value_name = "PATTERN")]
    pub only: Option<String>,
    /// Seed of every random number.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Ask scikit-sundae and heyoka now instead of comparing with recorded answers (needs Python 3.11).
    #[arg(long)]
    pub live_peers: bool,
    /// Put another solver through the suite: a program that speaks the peer protocol.
    #[arg(long, value_name = "CMD")]
    pub peer: Option<String>,
    /// Measured points to show with the paper's curve: a CSV with the columns `H/d` and `E_c/(d3 fc)`.
    #[arg(long, value_name = "POINTS.csv")]
    pub data: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Name of a user's peer in the suite.
const USER_PEER: &str = "user";

impl VerifyArgs {
    /// Runs the suite, writes the report and prints the summary.
    ///
    /// # Errors
    /// A suite, a scene or a folder that cannot be used (exit 2); a report that cannot be written (exit 1); a peer
    /// that cannot be started (exit 5).
    pub fn run(&self) -> Result<Exit, CliError> {
        folder::check(&self.out).map_err(folder_error)?;
        let mut suite = match &self.suite {
            Some(path) => Suite::read(path)?,
            None => Suite::embedded()?,
        };
        if let Some(pattern) = &self.only {
            suite.only(pattern);
            if suite.claims.is_empty() {
                return Err(CliError::usage(
                    format!("no claim has `{pattern}` in its id"),
                    "see the ids in `report.json`, or leave out --only",
                ));
            }
        }
        let points = self.data.as_deref().map(read_data).transpose()?.unwrap_or_default();
        if !points.is_empty() && !suite.claims.iter().any(|claim| matches!(claim.check, Check::Sweep { .. })) {
            return Err(CliError::usage(
                "no claim of the suite sweeps H/d, so --data would not be shown",
                "leave out --data, or --only",
            ));
        }
        let peers = self.peers()?;
        let progress = progress_bar(suite.claims.len() as u64);
        let running = Mutex::new(Counts::default());
        let judged = suite.run(self.seed, &peers, &|judged| advance(&progress, &running, judged));
        progress.finish_and_clear();
        let run = Run {
            suite: &suite,
            judged: &judged,
            environment: Environment::here(self.seed, self.command(), &suite, peers.describe()),
            points: &points,
        };
        folder::write(&run, &self.out).map_err(folder_error)?;
        let report = VerifyJson::new(&run);
        if !suite.is_embedded {
            for (table, looseness) in looseness(&judged).into_iter().filter(|(_, looseness)| *looseness > LOOSENESS_MAX)
            {
                let text = format!("the limit of {table} is {looseness:.0} times what is measured: it guards nothing");
                tell("warning: ", &text);
            }
        }
        if self.json { print_json(&report) } else { print_text(&self.text(&judged)) }.map_err(CliError::stdout)?;
        Ok(match report.verdict {
            Verdict::Passed | Verdict::Skipped => Exit::Success,
            Verdict::Failed => Exit::Criterion,
            Verdict::Undecided => Exit::Undecided,
        })
    }

    fn peers(&self) -> Result<PeerAnswers, CliError> {
        let mut peers = PeerAnswers::recorded().map_err(|error| CliError::Run {
            message: format!("a recorded answer cannot be read: {error}"),
            help: "remake it with `python3 verification/references/record.py`".to_owned(),
            last: None,
        })?;
        let start = |peers: &mut PeerAnswers, name: &str, command: &str| match peers.start(name, command) {
            Err(error) if error.is_usage() => {
                Err(CliError::usage(error.to_string(), "give a program and its arguments, quoted as for a shell"))
            }
            Err(error) if error.is_missing() => Err(CliError::PeerMissing(error.to_string())),
            // It started and then failed: its claims fail, and the others go on.
            Err(PeerStartError::Greeting(failure)) => {
                peers.fail(name, failure.to_string());
                Ok(())
            }
            Err(error) => Err(CliError::PeerMissing(error.to_string())),
            Ok(()) => Ok(()),
        };
        if self.live_peers {
            for (name, peer) in [
                ("sundae-adams", BundledPeer::SundaeAdams),
                ("sundae-bdf", BundledPeer::SundaeBdf),
                ("sundae-ida", BundledPeer::SundaeIda),
                ("heyoka-taylor", BundledPeer::Heyoka),
            ] {
                let environment = PeerEnvironment::ensure(peer, &mut |line| tell_line(line))
                    .map_err(|error| CliError::PeerMissing(error.to_string()))?;
                start(&mut peers, name, &environment.command(peer))?;
            }
        }
        if let Some(command) = &self.peer {
            start(&mut peers, USER_PEER, command)?;
        }
        Ok(peers)
    }

    /// The command that remakes this run.
    fn command(&self) -> String {
        let quote = |text: &str| shlex::try_quote(text).map_or_else(|_| text.to_owned(), std::borrow::Cow::into_owned);
        let mut words = vec!["penetrode verify".to_owned()];
        words.extend(self.suite.as_deref().map(quote));
        words.extend(self.only.as_deref().map(|pattern| format!("--only {}", quote(pattern))));
        words.push(format!("--seed {}", self.seed));
        if self.live_peers {
            words.push("--live-peers".to_owned());
        }
        words.extend(self.data.as_deref().map(|path| format!("--data {}", quote(&path.to_string_lossy()))));
        words.extend(self.peer.as_deref().map(|command| format!("--peer {}", quote(command))));
        words.join(" ")
    }

    fn text(&self, judged: &[Judged]) -> String {
        let (verdict, counts) = summary(judged);
        let mut text = String::new();
        for judged in judged.iter().filter(|j| matches!(j.verdict, Verdict::Failed | Verdict::Undecided)) {
            let measured = judged.measured.map_or("nothing measured".to_owned(), |m| {
                format!("{m:.3e}, limit {:.1e} {}", judged.claim.limit, judged.claim.check.unit())
            });
            text.push_str(&format!(
                "{:<9} {}\n{}\n{}\n",
                judged.verdict.name(),
                escape_terminal(&judged.claim.id),
                wrapped("          ", &escape_terminal(&judged.claim.statement)),
                wrapped("          ", &format!("{measured}; {}", escape_terminal(&judged.remark)))
            ));
        }
        text.push_str(&format!(
            "{}: {} passed, {} failed, {} undecided, {} skipped\nreport: {}\n",
            verdict.name(),
            counts.passed,
            counts.failed,
            counts.undecided,
            counts.skipped,
            self.out.join("report.html").display()
        ));
        text
    }
}

pub(super) fn folder_error(error: folder::FolderError) -> CliError {
    match error {
        folder::FolderError::NotOurs { .. } => {
            CliError::usage(error.to_string(), "name another folder with --out, or move away what is there")
        }
        folder::FolderError::Write { path, cause } => CliError::Write { path, cause },
    }
}

/// A bar with time left, on a terminal only.
fn progress_bar(length: u64) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} claims, {eta} left {msg}") {
        bar.set_style(style);
    }
    bar
}

fn advance(progress: &ProgressBar, running: &Mutex<Counts>, judged: &Judged) {
    progress.inc(1);
    if judged.verdict == Verdict::Failed
        && let Ok(mut counts) = running.lock()
    {
        counts.failed += 1;
        progress.set_message(format!("({} failed)", counts.failed));
    }
}
