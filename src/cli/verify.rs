//! `penetrode verify`: the verification suite and its report.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Args;
use indicatif::ProgressBar;

use super::output::{Text, escape_terminal, new_progress, say, say_line, show_progress};
use super::sweep::read_data;
use super::{Answer, Ask, CliError, Exit, command_typed, program};
use crate::exchange::peers::{BundledPeer, Environment as PeerEnvironment, PeerStartError};
use crate::report::{Environment, Run, VerifyJson, folder};
use crate::suite::checks::{PeerAnswers, PeerName, USER};
use crate::suite::{Check, Claim, Counts, Inputs, Judged, LOOSENESS_MAX, Program, Suite, Verdict, grouped, looseness};

/// Arguments of `verify`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/verify.txt"))]
pub struct VerifyArgs {
    /// Suite file (TOML) [default: the suite that ships].
    pub suite: Option<String>,
    /// Folder of the report [default: penetrode-report].
    ///
    /// With --only the default is penetrode-report-part.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Only claims whose id contains this; repeatable.
    ///
    /// With * for any text and ? for any character it is the whole id.
    #[arg(long, value_name = "PATTERN")]
    pub only: Vec<String>,
    /// List the claims with their ids, and judge none.
    #[arg(long, conflicts_with_all = ["out", "live_peers", "peer", "data", "json"])]
    pub list: bool,
    /// Seed of every random number.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Ask scikit-sundae and heyoka live.
    ///
    /// Instead of comparing with recorded answers; needs Python 3.11.
    #[arg(long)]
    pub live_peers: bool,
    /// Another solver, which speaks the peer protocol.
    #[arg(long, value_name = "CMD")]
    pub peer: Option<String>,
    /// Measured points to show with the paper's curve.
    ///
    /// A CSV with the columns `H/d` and `E_c/(d3 fc)`.
    #[arg(long, value_name = "POINTS.csv")]
    pub data: Option<PathBuf>,
}

impl Ask for VerifyArgs {
    type Answer = VerifyJson;

    fn ask(&self) -> Result<Answer<VerifyJson>, CliError> {
        let out = self
            .out
            .as_deref()
            .unwrap_or_else(|| Path::new(if self.only.is_empty() { folder::DEFAULT } else { folder::DEFAULT_OF_PART }));
        if !self.list {
            folder::check(out, "verify")?;
            self.only.first().map(|_| folder::check_for_part(out)).transpose()?;
        }
        let mut suite = match &self.suite {
            Some(path) => Suite::read(path)?,
            None => Suite::embedded()?,
        };
        if !self.only.is_empty() {
            suite.keep_only(&self.only).map_err(|pattern| {
                let what = if pattern.contains(['*', '?']) { "is" } else { "contains" };
                CliError::usage(format!("no claim has an id that {what} `{pattern}`"), "see the ids with --list")
            })?;
        }
        if self.list {
            return Ok(Answer { data: None, text: list(&suite), exit: Exit::Success });
        }
        let points = self.data.as_deref().map(read_data).transpose()?.unwrap_or_default();
        if !points.is_empty() && !suite.claims.iter().any(|claim| uses_points(&claim.check)) {
            return Err(CliError::usage(
                "no claim of the suite sweeps H/d or is about measured energies, so --data would not be used",
                "leave out --data, or --only",
            ));
        }
        let asks_peer = |claim: &Claim| matches!(&claim.check, Check::Peer(peer) if peer.name == PeerName::User);
        if self.peer.is_some() && !suite.claims.iter().any(asks_peer) {
            return Err(CliError::usage(
                "no claim of the suite asks the program of --peer, so it would not be judged",
                "add a claim with check = { peer = { name = \"user\", tolerance = 1e-6 } }, leave out --peer, or --only",
            ));
        }
        let peers = self.peers()?;
        // Without it the claims about commands would be skipped, and the suite pass.
        let program = program().and_then(|path| Program::new(&path)).map_err(|cause| {
            let help = "its claims run it in a temporary folder: let TMPDIR name one that can be written";
            CliError::failed(format!("the program cannot be run again: {cause}"), help)
        })?;
        let inputs = Inputs { seed: self.seed, peers: &peers, program: Some(&program), points: &points };
        let judged = judge_all(&suite, inputs, "claims");
        let run = Run {
            suite: &suite,
            judged: &judged,
            environment: Environment::here(self.seed, command_typed(), &suite, peers.describe()),
            points: &points,
            random: None,
        };
        folder::write(folder::files(&run), out)?;
        if !suite.is_embedded {
            for (table, looseness) in looseness(&judged).into_iter().filter(|(_, looseness)| *looseness > LOOSENESS_MAX)
            {
                let text = format!("the limit of {table} is {looseness:.0} times what is measured: it guards nothing");
                say("warning: ", &text);
            }
        }
        let mut text = Text::default();
        add_not_passed(&mut text, &judged);
        text.line(counts_text(&judged));
        text.lines(self.peer.as_deref().and_then(|command| diagnose_line(command, &judged)));
        text.line(report_line(out));
        let data = VerifyJson::new(&run);
        Ok(Answer { text: text.finish(), exit: data.verdict.into(), data: Some(data) })
    }
}

/// Whether a claim shows measured energies, or tests a conclusion with them.
fn uses_points(check: &Check) -> bool {
    matches!(check, Check::Sweep(_) | Check::BoundOfData(_))
}

impl VerifyArgs {
    fn peers(&self) -> Result<PeerAnswers, CliError> {
        let mut peers = PeerAnswers::recorded().map_err(|error| {
            let help = "remake it with `python3 verification/references/record.py`";
            CliError::failed(format!("a recorded answer cannot be read: {error}"), help)
        })?;
        let mut start = |name: &str, command: &str| match peers.start(name, command) {
            // It started and then failed: its claims fail, and the others are judged all the same.
            Err(PeerStartError::Greeting(failure)) => {
                peers.fail(name, failure.to_string());
                Ok(())
            }
            started => started,
        };
        if self.live_peers {
            for (name, peer) in [
                ("sundae-adams", BundledPeer::SundaeAdams),
                ("sundae-bdf", BundledPeer::SundaeBdf),
                ("sundae-ida", BundledPeer::SundaeIda),
                ("heyoka-taylor", BundledPeer::Heyoka),
            ] {
                start(name, &PeerEnvironment::ensure(peer, &mut |line| say_line(line))?.command(peer))?;
            }
        }
        if let Some(command) = &self.peer {
            start(USER, command)?;
        }
        Ok(peers)
    }
}

/// The ids of the claims of `suite`, those of one table with what they say behind them.
pub(super) fn list(suite: &Suite) -> String {
    let mut text = Text::default();
    for claims in suite.claims.chunk_by(|a, b| a.table == b.table) {
        text.lines(claims.iter().map(|claim| escape_terminal(&claim.id)));
        text.wrapped("    ", &escape_terminal(&claims[0].statement));
    }
    text.finish()
}

/// Where the report is.
pub(super) fn report_line(folder: &Path) -> String {
    format!("report: {}", folder.join("report.html").display())
}

/// Adds every failed or undecided claim, with its statement and what was seen; claims of one table of which nothing was
/// measured, for one reason, are named once.
pub(super) fn add_not_passed(text: &mut Text, judged: &[Judged]) {
    let open = judged.iter().filter(|judged| judged.is_open());
    let reasons = grouped(open, |judged| {
        let Judged { claim, verdict, measured, remark, .. } = judged;
        (&claim.table, verdict, remark, measured.map(|_| &claim.id))
    });
    for (_, claims) in reasons {
        let Judged { claim, verdict, measured, remark, .. } = claims[0];
        let measured = measured.map_or("nothing measured".to_owned(), |m| {
            format!("{m:.3e}, limit {:.1e} {}", claim.limit, claim.unit_in_words())
        });
        text.line(format!("{:<9} {}", verdict.name(), escape_terminal(&claim.id)));
        if claims.len() > 1 {
            let others = format!("and {} more of {}", claims.len() - 1, escape_terminal(&claim.table));
            text.wrapped("          ", &others);
        }
        text.wrapped("          ", &escape_terminal(&claim.statement));
        text.wrapped("          ", &format!("{measured}; {}", escape_terminal(remark)));
    }
}

/// The verdict and how many claims came to it, as one line.
pub(super) fn counts_text(judged: &[Judged]) -> String {
    let counts = Counts::of_claims(judged);
    let Counts { passed, failed, undecided, skipped } = counts;
    let verdict = counts.verdict().name();
    format!("{verdict}: {passed} passed, {failed} failed, {undecided} undecided, {skipped} skipped")
}

/// Who says what is wrong with the program of `command`, if a claim about its numbers failed.
pub(super) fn diagnose_line(command: &str, judged: &[Judged]) -> Option<String> {
    let is_wrong = |judged: &Judged| {
        let claim = &judged.claim;
        judged.verdict == Verdict::Failed && claim.id.split('/').any(|part| part == USER)
    };
    let command = shlex::try_quote(command).unwrap_or(command.into());
    judged.iter().any(is_wrong).then(|| format!("what is wrong with it: penetrode diagnose {command}"))
}

/// Judges every claim of `suite` behind a progress bar that counts `what`.
pub(super) fn judge_all(suite: &Suite, inputs: Inputs<'_>, what: &str) -> Vec<Judged> {
    let bar = progress_bar(suite.claims.len() as u64, what);
    let failed = AtomicUsize::new(0);
    let judged = suite.run(inputs, &|judged| {
        bar.inc(1);
        if judged.verdict == Verdict::Failed {
            bar.set_message(format!("({} failed)", failed.fetch_add(1, Ordering::Relaxed) + 1));
        }
    });
    bar.finish_and_clear();
    judged
}

/// A bar that counts `what`.
pub(super) fn progress_bar(length: u64, what: &str) -> ProgressBar {
    let bar = new_progress();
    show_progress(&bar, length, &format!("{{bar:30}} {{pos}}/{{len}} {what}, {{eta}} left {{msg}}"));
    bar
}
