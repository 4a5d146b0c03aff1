//! The report of `stress`: its JSON, and a folder with a page of its own.

use std::io;

use schemars::JsonSchema;
use serde::Serialize;

use super::environment::Environment;
use super::figure::Figure;
use super::folder::figure_files;
use super::json::ClaimJson;
use super::stress_page;
use crate::integrators::MethodName;
use crate::studies::extreme_scenes::{self, Summary};
use crate::suite::stress::{JudgedCase, counts};
use crate::suite::{Counts, Verdict};

/// A finished run of the stress cases.
#[derive(Debug)]
pub struct StressRun<'a> {
    /// The cases, judged, in the order of reports; last the random scenes as one.
    pub judged: &'a [JudgedCase],
    /// What the random scenes showed and the time spent on them [ms]; `None` where none were asked for.
    pub random: Option<(&'a Summary, f64)>,
    /// Where it ran and what remakes it.
    pub environment: Environment,
}

/// What `stress --json` prints, and `report.json` of its folder.
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

impl StressJson {
    /// The run as data.
    pub fn new(run: &StressRun<'_>) -> Self {
        let counts = counts(run.judged);
        let seed = run.environment.seed;
        Self {
            schema: "penetrode/stress/1",
            verdict: counts.verdict(),
            counts,
            claims: run.judged.iter().map(ClaimJson::from).collect(),
            random_scenes: run.random.map(|(summary, wall_ms)| RandomScenesJson::new(summary, seed, wall_ms)),
            environment: run.environment.clone(),
        }
    }
}

impl RandomScenesJson {
    fn new(summary: &Summary, seed: u64, wall_ms: f64) -> Self {
        let text = |index: u64| {
            let title = format!("random scene {index} of seed {seed}");
            extreme_scenes::scene_text(&extreme_scenes::scene(seed, index), &title)
        };
        Self {
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

impl From<&JudgedCase> for ClaimJson {
    fn from(case: &JudgedCase) -> Self {
        Self {
            id: case.id.clone(),
            statement: case.statement.to_owned(),
            scene: None,
            method: case.method.map(MethodName::name),
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

/// Every file of the report: its path in the folder, and its bytes.
///
/// # Errors
/// Only what makes memory run out, or a figure that cannot be drawn.
pub fn files(run: &StressRun<'_>) -> io::Result<Vec<(String, Vec<u8>)>> {
    let figures = stress_page::figures(run)
        .into_iter()
        .map(Figure::draw)
        .collect::<Result<Vec<_>, _>>()
        .map_err(io::Error::other)?;
    let mut json = serde_json::to_vec_pretty(&StressJson::new(run))?;
    json.push(b'\n');
    let mut files = vec![
        ("report.json".to_owned(), json),
        ("report.html".to_owned(), stress_page::to_html(run, &figures).into_bytes()),
    ];
    files.extend(figure_files(&figures)?);
    Ok(files)
}
