//! `penetrode stress`: numerical stability and event stress cases, and random scenes by the million.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::output::{Text, error_text, escape_terminal};
use super::verify::{add_not_passed, counts_text, judge_all, progress_bar, report_line};
use super::{Answer, Ask, CliError, Exit, command_typed};
use crate::report::{self, Environment, Run, StressJson, cells, folder};
use crate::studies::extreme_scenes::{self, Summary, ULPS_MAX};
use crate::suite::checks::{PeerAnswers, judged_random_scenes};
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
    /// Print random scene N of the seed as a scene file, and run nothing.
    #[arg(long, value_name = "N", conflicts_with_all = ["cases", "out", "json"])]
    pub show: Option<u64>,
    /// Write the report to this folder: every case with its limit and reason, figures, JSON.
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
        self.out.as_deref().map(folder::check).transpose()?;
        let suite = Suite::edges()?;
        // No case is about commands.
        let inputs = Inputs { seed: self.seed, peers: &PeerAnswers::default(), program: None };
        let mut judged = judge_all(&suite, inputs, "cases");
        let random = self.cases.map(|cases| self.run_random(cases));
        judged.extend(random.as_ref().and_then(|(summary, wall_ms)| judged_random_scenes(&suite, summary, *wall_ms)));
        let run = Run {
            suite: &suite,
            judged: &judged,
            environment: Environment::here(self.seed, command_typed(), &suite, Vec::new()),
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
