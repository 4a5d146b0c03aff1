//! `penetrode stress`: numerical stability and event stress cases, and random scenes by the million.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::output::{error_text, escape_terminal, print_json, print_text, table, table_lines, wrapped};
use super::verify::folder_error;
use super::{CliError, Exit};
use crate::report::stress::{StressJson, StressRun};
use crate::report::{self, Environment, folder};
use crate::studies::extreme_scenes::{self, Summary, ULPS_MAX};
use crate::suite::stress::{self, JudgedCase};
use crate::suite::{Counts, Suite, Verdict};

/// Arguments of `stress`.
#[derive(Args, Debug)]
#[command(after_help = "Cases: E events at their edges, S steps, range, rounding and stiffness, V critical velocity. \
    --out DIR writes them as a report; that of verify shows the stability map and the rounding floor too.\n\n\
    Exit codes: 0 all hold, 3 a case failed, 4 undecided.")]
pub struct StressArgs {
    /// Random scenes to fly besides the cases.
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
            folder::check(out).map_err(folder_error)?;
        }
        let mut judged = self.run_cases();
        let random = self.cases.map(|cases| self.run_random(cases));
        if let Some((summary, wall_ms)) = &random {
            judged.push(judge_random(summary, *wall_ms));
        }
        let counts = stress::counts(&judged);
        let run = StressRun {
            judged: &judged,
            random: random.as_ref().map(|(summary, wall_ms)| (summary, *wall_ms)),
            environment: Environment::here(self.seed, self.command(), &Suite::embedded()?, Vec::new()),
        };
        if let Some(out) = &self.out {
            let failed = |cause| CliError::Write { path: out.display().to_string(), cause };
            folder::write_files(report::stress::files(&run).map_err(failed)?, out).map_err(folder_error)?;
        }
        if self.json {
            print_json(&StressJson::new(&run))
        } else {
            let mut text = text(&judged, counts, run.random.map(|(summary, _)| summary));
            if let Some(out) = &self.out {
                let _ = writeln!(text, "report: {}", out.join("report.html").display());
            }
            print_text(&text)
        }
        .map_err(CliError::stdout)?;
        Ok(match counts.verdict() {
            Verdict::Passed | Verdict::Skipped => Exit::Success,
            Verdict::Failed => Exit::Criterion,
            Verdict::Undecided => Exit::Undecided,
        })
    }

    fn run_cases(&self) -> Vec<JudgedCase> {
        let total = stress::cases().iter().map(|case| case.methods.len().max(1) as u64).sum();
        let bar = progress_bar(total, "cases");
        let failed = Mutex::new(0_u32);
        let judged = stress::run(self.seed, &|case| {
            bar.inc(1);
            if case.verdict == Verdict::Failed
                && let Ok(mut failed) = failed.lock()
            {
                *failed += 1;
                bar.set_message(format!("({failed} failed)"));
            }
        });
        bar.finish_and_clear();
        judged
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
}

/// The random scenes as one case.
fn judge_random(summary: &Summary, wall_ms: f64) -> JudgedCase {
    let first = summary.defects.first().map(|d| format!("; scene {}: {}", d.index, d.what)).unwrap_or_default();
    let nothing_seen = summary.scenes == summary.unresolved;
    JudgedCase {
        id: "random-scenes".to_owned(),
        statement: "every random scene: outcomes right or undecided, every number within its limit",
        method: None,
        verdict: if nothing_seen { Verdict::Undecided } else { Verdict::of(summary.defect_count as f64, 0.0) },
        measured: Some(summary.defect_count as f64),
        limit: 0.0,
        unit: "defects",
        reason: "zero: an outcome is right, or inside its own bar; numbers keep to 64 ulp times their condition number",
        remark: format!("{} scenes, {} unresolved{first}", summary.scenes, summary.unresolved),
        evidence: None,
        wall_ms,
    }
}

fn text(judged: &[JudgedCase], counts: Counts, random: Option<&Summary>) -> String {
    let mut text = String::new();
    for line in table_lines(&cases_table(judged)) {
        text.push_str(&line);
        text.push('\n');
    }
    for case in judged.iter().filter(|case| matches!(case.verdict, Verdict::Failed | Verdict::Undecided)) {
        let measured = case.measured.map_or("nothing measured".to_owned(), |m| {
            format!("{}, limit {:.1e} {}", error_text(Some(m)), case.limit, case.unit)
        });
        let _ = write!(
            text,
            "{:<9} {}\n{}\n{}\n",
            case.verdict.name(),
            case.id,
            wrapped("          ", case.statement),
            wrapped("          ", &format!("{measured}; {}", escape_terminal(&case.remark)))
        );
    }
    text.push_str(&skipped_text(judged));
    if let Some(summary) = random {
        text.push_str(&random_text(summary));
    }
    let _ = writeln!(
        text,
        "{}: {} passed, {} failed, {} undecided, {} skipped",
        counts.verdict().name(),
        counts.passed,
        counts.failed,
        counts.undecided,
        counts.skipped
    );
    text
}

/// One row a case: how many methods passed, and the largest of what was measured.
fn cases_table(judged: &[JudgedCase]) -> comfy_table::Table {
    let mut rows = table(&["case", "passed", "skipped", "worst", "limit", "unit"]);
    let case_of = |case: &JudgedCase| case.id.split('/').next().unwrap_or_default().to_owned();
    for cases in judged.chunk_by(|a, b| case_of(a) == case_of(b)) {
        let counts = Counts::of(cases.iter().map(|case| case.verdict));
        let worst = cases.iter().filter_map(|case| case.measured).max_by(f64::total_cmp);
        rows.add_row([
            case_of(&cases[0]),
            format!("{} of {}", counts.passed, cases.len() - counts.skipped),
            if counts.skipped > 0 { counts.skipped.to_string() } else { String::new() },
            error_text(worst),
            limit_text(cases[0].limit),
            cases[0].unit.to_owned(),
        ]);
    }
    rows
}

/// A limit as it was set: few digits, and no exponent where none is needed.
fn limit_text(limit: f64) -> String {
    if limit == 0.0 || (1e-3..1e6).contains(&limit) { limit.to_string() } else { format!("{limit:e}") }
}

/// Why cases were skipped, each reason once with how many it held back.
fn skipped_text(judged: &[JudgedCase]) -> String {
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for case in judged.iter().filter(|case| case.verdict == Verdict::Skipped) {
        match reasons.iter_mut().find(|(known, _)| *known == case.remark) {
            Some((_, count)) => *count += 1,
            None => reasons.push((&case.remark, 1)),
        }
    }
    let lines = reasons
        .iter()
        .map(|(reason, count)| wrapped("  ", &format!("{count} skipped: {}", escape_terminal(reason))) + "\n");
    lines.collect()
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
    for line in table_lines(&outcomes).into_iter().chain(table_lines(&worst)) {
        text.push_str(&line);
        text.push('\n');
    }
    for defect in &summary.defects {
        let _ =
            writeln!(text, "{}", wrapped("  ", &format!("scene {}: {}", defect.index, escape_terminal(&defect.what))));
    }
    text
}

/// A bar with time left, on a terminal only.
fn progress_bar(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template(&format!("{{bar:30}} {{pos}}/{{len}} {what}, {{eta}} left {{msg}}"))
    {
        bar.set_style(style);
    }
    bar
}
