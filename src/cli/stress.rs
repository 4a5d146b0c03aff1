//! `penetrode stress`: numerical stability and event stress cases, and random scenes by the million.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::output::{Text, error_text, escape_terminal};
use super::verify::{add_not_passed, counts_text, diagnose_line, judge_all, list, progress_bar, report_line};
use super::{Answer, Ask, CliError, Exit, command_typed};
use crate::exchange::peers::Peer;
use crate::report::{self, Environment, Run, StressJson, cells, folder};
use crate::studies::diagnosis::{self, Plan};
use crate::studies::extreme_scenes::{self, Summary, ULPS_MAX};
use crate::suite::checks::{PeerAnswers, USER, judged_answers, judged_random_scenes};
use crate::suite::{Counts, Inputs, Judged, Suite, skipped, tables, worst};
use crate::text::Shown;

/// Arguments of `stress`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/stress.txt"))]
pub struct StressArgs {
    /// Random scenes to solve besides the cases.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub cases: Option<u64>,
    /// Seed of every random number.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Put this solver through events at their edges.
    ///
    /// And through N random problems: a program that speaks the peer protocol and takes a tolerance.
    #[arg(long, value_name = "CMD")]
    pub peer: Option<String>,
    /// List the cases with what they say, and run none.
    #[arg(long, conflicts_with_all = ["cases", "out", "json", "peer"])]
    pub list: bool,
    /// Print random scene N as a scene file, and run nothing.
    #[arg(long, value_name = "N", conflicts_with_all = ["cases", "out", "json", "peer", "list"])]
    pub show: Option<u64>,
    /// Write the report to this folder.
    ///
    /// Every case with its limit and reason, figures, JSON.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

impl Ask for StressArgs {
    type Answer = StressJson;

    fn ask(&self) -> Result<Answer<StressJson>, CliError> {
        if let Some(index) = self.show {
            let title = format!("random scene {index} of seed {}", self.seed);
            let text = extreme_scenes::scene_text(&extreme_scenes::scene(self.seed, index), &title);
            return Ok(Answer { data: None, text: text.unwrap_or_default(), exit: Exit::Success });
        }
        let suite = Suite::edges()?;
        if self.list {
            return Ok(Answer { data: None, text: list(&suite), exit: Exit::Success });
        }
        self.out.as_deref().map(|folder| folder::check(folder, "stress")).transpose()?;
        // No case is about commands.
        let inputs = Inputs { seed: self.seed, peers: &PeerAnswers::default(), program: None, points: &[] };
        let mut peers = Vec::new();
        let (judged, random) = if let Some(command) = &self.peer {
            let (identity, judged) = self.run_peer(command, &suite)?;
            peers.push((USER.to_owned(), identity));
            (judged, None)
        } else {
            let mut judged = judge_all(&suite, inputs, "cases");
            let random = self.cases.map(|cases| self.run_random(cases));
            let as_claim =
                random.as_ref().and_then(|(summary, wall_ms)| judged_random_scenes(&suite, summary, *wall_ms));
            judged.extend(as_claim);
            (judged, random)
        };
        let run = Run {
            suite: &suite,
            judged: &judged,
            environment: Environment::here(self.seed, command_typed(), &suite, peers),
            points: &[],
            random: random.as_ref().map(|(summary, wall_ms)| (summary, *wall_ms)),
        };
        self.out.as_deref().map(|folder| folder::write(report::stress::files(&run), folder)).transpose()?;
        let data = StressJson::new(&run);
        Ok(Answer { text: self.text(&run), exit: data.verdict.into(), data: Some(data) })
    }
}

impl StressArgs {
    fn run_random(&self, cases: u64) -> (Summary, f64) {
        let bar = progress_bar(cases, "scenes");
        let started = Instant::now();
        let summary = extreme_scenes::run(cases, self.seed, &|| bar.inc(1));
        bar.finish_and_clear();
        (summary, started.elapsed().as_secs_f64() * 1e3)
    }

    /// Who the program of `command` says it is, and how it fares.
    fn run_peer(&self, command: &str, suite: &Suite) -> Result<(String, Vec<Judged>), CliError> {
        let mut peer = Peer::start_adaptive(command)?;
        let identity = format!("{}, asked by `{command}`", peer.identity());
        let bar = progress_bar(0, "problems");
        let started = Instant::now();
        let questions = self.cases.map_or(0, |cases| cases as usize);
        let asked =
            diagnosis::at_edges(&mut peer, Plan { seed: self.seed, questions, asks_edges: true }, &|asked, all| {
                bar.set_length(all as u64);
                bar.set_position(asked as u64);
            });
        bar.finish_and_clear();
        Ok((identity, judged_answers(suite, &asked, started.elapsed().as_secs_f64() * 1e3)))
    }

    fn text(&self, run: &Run<'_>) -> String {
        let mut text = Text::default();
        text.table(&["case", "passed", "skipped", "worst", "limit", "unit"], tables(run.judged).map(case_row));
        add_not_passed(&mut text, run.judged);
        for (reason, count) in skipped(run.judged) {
            text.wrapped("  ", &format!("{count} skipped: {}", escape_terminal(reason)));
        }
        if let Some((summary, _)) = run.random {
            add_random(&mut text, summary);
        }
        text.line(counts_text(run.judged));
        text.lines(self.peer.as_deref().and_then(|command| diagnose_line(command, run.judged)));
        text.lines(self.out.as_deref().map(report_line));
        text.finish()
    }
}

/// How many methods passed `cases` of one table, and the largest of what was measured.
fn case_row(cases: &[Judged]) -> [String; 6] {
    let (claim, counts) = (&cases[0].claim, Counts::of_claims(cases));
    [
        claim.table.clone(),
        format!("{} of {}", counts.passed, cases.len() - counts.skipped),
        if counts.skipped > 0 { counts.skipped.to_string() } else { String::new() },
        error_text(worst(cases)),
        Shown(claim.limit).to_string(),
        claim.unit.to_owned(),
    ]
}

fn add_random(text: &mut Text, summary: &Summary) {
    let Summary { scenes, unresolved, critical_found, critical_refused, asked_reference, .. } = summary;
    text.wrapped(
        "random scenes: ",
        &format!(
            "{scenes}, of which {unresolved} do not resolve; critical velocities: {critical_found} agree, \
             {critical_refused} out of range; 50 digits asked for {asked_reference}"
        ),
    );
    text.table(&cells::OUTCOMES, cells::outcomes(summary));
    text.wrapped("  ", &format!("worst errors, limit {ULPS_MAX:.0}:"));
    text.table(&cells::WORST, cells::worst(summary));
    for defect in &summary.defects {
        text.wrapped("  ", &format!("scene {}: {}", defect.index, escape_terminal(&defect.what)));
    }
}
