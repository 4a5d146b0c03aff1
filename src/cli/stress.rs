//! `penetrode stress`: numerical stability and event stress cases, and random scenes by the million.

use std::fmt::Write as _;
use std::sync::Mutex;
use std::time::Instant;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use schemars::JsonSchema;
use serde::Serialize;

use super::output::{error_text, escape_terminal, print_json, print_text, table, table_lines, wrapped};
use super::{CliError, Exit};
use crate::report::Environment;
use crate::report::json::ClaimJson;
use crate::studies::extreme_scenes::{self, Summary, ULPS_MAX};
use crate::suite::stress::{self, JudgedCase};
use crate::suite::{Counts, Suite, Verdict};

/// Arguments of `stress`.
#[derive(Args, Debug)]
pub struct StressArgs {
    /// Random scenes to fly besides the cases.
    #[arg(long, value_name = "N")]
    pub cases: Option<u64>,
    /// Seed of every random number.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print random scene N of the seed as a scene file, and run nothing.
    #[arg(long, value_name = "N", conflicts_with = "cases")]
    pub show: Option<u64>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `stress --json` prints.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StressJson {
    /// `penetrode/stress/1`.
    pub schema: &'static str,
    /// Verdict of the whole.
    pub verdict: Verdict,
    /// How many cases came to what.
    pub counts: Counts,
    /// The cases, in the order of reports; last the random scenes as one.
    pub claims: Vec<ClaimJson>,
    /// What the random scenes showed; `null` where none were asked for.
    pub random_scenes: Option<RandomScenesJson>,
    /// Where it ran and what remakes it.
    pub environment: Environment,
}

/// What many random scenes showed.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RandomScenesJson {
    /// Scenes examined.
    pub scenes: u64,
    /// Scenes whose coefficients leave the range of 64-bit numbers.
    pub unresolved: u64,
    /// Scenes for which 50 digits were asked.
    pub asked_reference: u64,
    /// Critical velocities that agree.
    pub critical_found: u64,
    /// Critical velocities refused with their cause, as out of range.
    pub critical_refused: u64,
    /// Outcomes by method.
    pub methods: Vec<TallyJson>,
    /// Worst errors by method and quantity.
    pub worst: Vec<WorstJson>,
    /// Limits missed, all of them.
    pub defect_count: u64,
    /// The first of them.
    pub defects: Vec<DefectJson>,
    /// Time spent [ms].
    pub wall_ms: f64,
}

/// Outcomes of one method.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TallyJson {
    /// Name of the method.
    pub method: &'static str,
    /// Right outcomes.
    pub right: u64,
    /// Outcomes inside the method's own bar.
    pub undecided: u64,
    /// Scenes without an answer.
    pub refused: u64,
    /// Wrong outcomes.
    pub wrong: u64,
}

/// The worst error of a method in a quantity.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct WorstJson {
    /// Name of the method.
    pub method: &'static str,
    /// Quantity.
    pub quantity: &'static str,
    /// Error in units of round-off over max(1, condition number); `null` if it is not a number.
    pub ulps: Option<f64>,
    /// Number of the scene that makes it.
    pub scene: u64,
    /// That scene as a file; `null` if it has no such form.
    pub text: Option<String>,
}

/// A limit missed.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DefectJson {
    /// Number of the scene.
    pub scene: u64,
    /// What is wrong.
    pub what: String,
}

impl StressArgs {
    /// Runs the cases, and the random scenes if asked, and prints the summary.
    ///
    /// # Errors
    /// Standard output that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        if let Some(index) = self.show {
            let title = format!("random scene {index} of seed {}", self.seed);
            let text = extreme_scenes::scene_text(&extreme_scenes::scene(self.seed, index), &title);
            print_text(&text.unwrap_or_default()).map_err(CliError::stdout)?;
            return Ok(Exit::Success);
        }
        let mut judged = self.run_cases();
        let random = self.cases.map(|cases| self.run_random(cases));
        if let Some((summary, wall_ms)) = &random {
            judged.push(judge_random(summary, *wall_ms));
        }
        let counts = stress::counts(&judged);
        if self.json {
            let report = StressJson {
                schema: "penetrode/stress/1",
                verdict: counts.verdict(),
                counts,
                claims: judged.iter().map(ClaimJson::from).collect(),
                random_scenes: random.as_ref().map(|(summary, wall_ms)| self.random_json(summary, *wall_ms)),
                environment: Environment::here(self.seed, self.command(), &Suite::embedded()?, Vec::new()),
            };
            print_json(&report)
        } else {
            print_text(&text(&judged, counts, random.as_ref().map(|(summary, _)| summary)))
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

    fn random_json(&self, summary: &Summary, wall_ms: f64) -> RandomScenesJson {
        let text = |index: u64| {
            let title = format!("random scene {index} of seed {}", self.seed);
            extreme_scenes::scene_text(&extreme_scenes::scene(self.seed, index), &title)
        };
        RandomScenesJson {
            scenes: summary.scenes,
            unresolved: summary.unresolved,
            asked_reference: summary.asked_reference,
            critical_found: summary.critical_found,
            critical_refused: summary.critical_refused,
            methods: summary
                .tallies
                .iter()
                .map(|(method, tally)| TallyJson {
                    method: method.name(),
                    right: tally.right,
                    undecided: tally.undecided,
                    refused: tally.refused,
                    wrong: tally.wrong,
                })
                .collect(),
            worst: summary
                .worst
                .iter()
                .map(|((method, quantity), worst)| WorstJson {
                    method: method.name(),
                    quantity: quantity.name(),
                    ulps: Some(worst.units).filter(|units| units.is_finite()),
                    scene: worst.index,
                    text: text(worst.index),
                })
                .collect(),
            defect_count: summary.defect_count,
            defects: summary
                .defects
                .iter()
                .map(|defect| DefectJson { scene: defect.index, what: defect.what.clone() })
                .collect(),
            wall_ms,
        }
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
        wall_ms,
    }
}

impl From<&JudgedCase> for ClaimJson {
    fn from(case: &JudgedCase) -> Self {
        Self {
            id: case.id.clone(),
            statement: case.statement.to_owned(),
            scene: None,
            method: case.method.map(crate::integrators::MethodName::name),
            quantity: None,
            verdict: case.verdict,
            measured: case.measured,
            limit: case.limit,
            unit: case.unit,
            reason: case.reason.to_owned(),
            remark: case.remark.clone(),
            wall_ms: case.wall_ms,
        }
    }
}

fn text(judged: &[JudgedCase], counts: Counts, random: Option<&Summary>) -> String {
    let mut text = String::new();
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
        let _ = writeln!(text, "  scene {}: {}", defect.index, escape_terminal(&defect.what));
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
