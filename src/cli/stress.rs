//! `penetrode stress`: numerical stability and event stress cases, and random scenes by the million.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::output::{error_text, escape_terminal, print_json, print_text, table, table_lines, wrapped};
use super::verify::{counts_text, judge_all, not_passed_text, progress_bar};
use super::{CliError, Exit};
use crate::report::{self, Environment, Run, StressJson, folder};
use crate::studies::extreme_scenes::{self, Summary, ULPS_MAX};
use crate::suite::checks::{PeerAnswers, judged_random_scenes};
use crate::suite::{Counts, Judged, Suite, skipped, tables, worst};

/// Arguments of `stress`.
#[derive(Args, Debug)]
#[command(after_help = "Cases: E events at their edges, S steps, range, rounding and stiffness, V critical velocity. \
    --out DIR writes them as a report; that of verify shows the stability map and the rounding floor too.\n\n\
    Exit codes: 0 all hold, 3 a case failed, 4 undecided.")]
pub struct StressArgs {
    /// Random scenes to solve besides the cases.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub cases: Option<u64>,
    /// Seed of every random number.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print random scene N of the seed as a scene file, and run nothing.
    #[arg(long, value_name = "N", conflicts_with = "cases")]
    pub show: Option<u64>,
    /// Write the report to this folder: every case with its limit and reason, figures, JSON.
    #[arg(long, value_name = "DIR", conflicts_with = "show")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long, conflicts_with = "show")]
    pub json: bool,
}

impl StressArgs {
    /// Runs the cases, and the random scenes if asked, and prints the summary.
    ///
    /// # Errors
    /// A folder that is no report of ours (exit 2); a report or standard output that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        if let Some(index) = self.show {
            let title = format!("random scene {index} of seed {}", self.seed);
            let text = extreme_scenes::scene_text(&extreme_scenes::scene(self.seed, index), &title);
            print_text(&text.unwrap_or_default()).map_err(CliError::stdout)?;
            return Ok(Exit::Success);
        }
        if let Some(out) = &self.out {
            folder::check(out)?;
        }
        let suite = Suite::edges()?;
        let mut judged = judge_all(&suite, self.seed, &PeerAnswers::default(), "cases");
        let random = self.cases.map(|cases| self.run_random(cases));
        judged.extend(random.as_ref().map(|(summary, wall_ms)| judged_random_scenes(summary, *wall_ms)));
        let run = Run {
            suite: &suite,
            judged: &judged,
            environment: Environment::here(self.seed, self.command(), &suite, Vec::new()),
            points: &[],
            random: random.as_ref().map(|(summary, wall_ms)| (summary, *wall_ms)),
        };
        if let Some(out) = &self.out {
            folder::write(report::stress::files(&run), out)?;
        }
        let report = StressJson::new(&run);
        if self.json { print_json(&report) } else { print_text(&self.text(&run)) }.map_err(CliError::stdout)?;
        Ok(report.verdict.into())
    }

    fn run_random(&self, cases: u64) -> (Summary, f64) {
        let bar = progress_bar(cases, "scenes");
        let started = Instant::now();
        let summary = extreme_scenes::run(cases, self.seed, &|| bar.inc(1));
        bar.finish_and_clear();
        (summary, started.elapsed().as_secs_f64() * 1e3)
    }

    /// The command that remakes this run.
    fn command(&self) -> String {
        let cases = self.cases.map(|cases| format!(" --cases {cases}")).unwrap_or_default();
        format!("penetrode stress{cases} --seed {}", self.seed)
    }

    fn text(&self, run: &Run<'_>) -> String {
        let mut text = lines_of(&cases_table(run.judged)) + &not_passed_text(run.judged) + &skipped_text(run.judged);
        if let Some((summary, _)) = run.random {
            text.push_str(&random_text(summary));
        }
        text.push_str(&counts_text(run.judged));
        if let Some(out) = &self.out {
            let _ = writeln!(text, "report: {}", out.join("report.html").display());
        }
        text
    }
}

/// A table as text.
fn lines_of(rows: &comfy_table::Table) -> String {
    table_lines(rows).join("\n") + "\n"
}

/// One row a case: how many methods passed, and the largest of what was measured.
fn cases_table(judged: &[Judged]) -> comfy_table::Table {
    let mut rows = table(&["case", "passed", "skipped", "worst", "limit", "unit"]);
    for cases in tables(judged) {
        let (claim, counts) = (&cases[0].claim, Counts::of_claims(cases));
        rows.add_row([
            claim.table.clone(),
            format!("{} of {}", counts.passed, cases.len() - counts.skipped),
            if counts.skipped > 0 { counts.skipped.to_string() } else { String::new() },
            error_text(worst(cases)),
            limit_text(claim.limit),
            claim.unit.to_owned(),
        ]);
    }
    rows
}

/// A limit as it was set: few digits, and no exponent where none is needed.
fn limit_text(limit: f64) -> String {
    if limit == 0.0 || (1e-3..1e6).contains(&limit) { limit.to_string() } else { format!("{limit:e}") }
}

/// Why cases were skipped, each reason once with how many it held back.
fn skipped_text(judged: &[Judged]) -> String {
    let line = |(reason, count)| wrapped("  ", &format!("{count} skipped: {}", escape_terminal(reason))) + "\n";
    skipped(judged).into_iter().map(line).collect()
}

fn random_text(summary: &Summary) -> String {
    let counts = format!(
        "{}, of which {} do not resolve; critical velocities: {} agree, {} out of range; 50 digits asked for {}",
        summary.scenes, summary.unresolved, summary.critical_found, summary.critical_refused, summary.asked_reference
    );
    let mut text = wrapped("random scenes: ", &counts) + "\n";
    let mut outcomes = table(&["outcomes of", "right", "undecided", "refused", "wrong"]);
    for (method, tally) in &summary.tallies {
        outcomes.add_row([
            method.name().to_owned(),
            tally.right.to_string(),
            tally.undecided.to_string(),
            tally.refused.to_string(),
            tally.wrong.to_string(),
        ]);
    }
    let mut worst = table(&["worst error", "quantity", "ulp x condition", "limit", "scene"]);
    for ((method, quantity), held) in &summary.worst {
        worst.add_row([
            method.name().to_owned(),
            quantity.name().to_owned(),
            format!("{:.1}", held.units),
            format!("{ULPS_MAX:.0}"),
            held.index.to_string(),
        ]);
    }
    text.push_str(&(lines_of(&outcomes) + &lines_of(&worst)));
    for defect in &summary.defects {
        let _ =
            writeln!(text, "{}", wrapped("  ", &format!("scene {}: {}", defect.index, escape_terminal(&defect.what))));
    }
    text
}
