//! `report.json`: what `verify --json` and `stress --json` print.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Environment, Run};
use crate::studies::extreme_scenes::{self, Summary, Tally};
use crate::suite::{Counts, Judged, Verdict};

/// A judged suite.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VerifyJson {
    /// `penetrode/verify/1`.
    pub schema: &'static str,
    /// Title of the suite.
    pub title: String,
    /// Patterns of the claims that were judged; absent where all were.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub only: Vec<String>,
    /// Verdict of the whole.
    pub verdict: Verdict,
    /// How many claims came to what.
    pub counts: Counts,
    /// The claims, in the suite's order.
    pub claims: Vec<Judged>,
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
    pub claims: Vec<Judged>,
    /// What the random scenes showed; `null` where none were asked for.
    pub random_scenes: Option<RandomScenesJson>,
    /// Where it ran and what remakes it.
    pub environment: Environment,
}

/// What many random scenes showed.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RandomScenesJson {
    /// Scenes, critical velocities and defects, counted.
    #[serde(flatten)]
    pub summary: Summary,
    /// Outcomes by method.
    pub methods: Vec<TallyJson>,
    /// Worst errors by method and quantity.
    pub worst: Vec<WorstJson>,
    /// Time spent (ms).
    pub wall_ms: f64,
}

/// Outcomes of one method.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TallyJson {
    /// Name of the method.
    pub method: &'static str,
    /// Its outcomes, counted.
    #[serde(flatten)]
    pub tally: Tally,
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

impl VerifyJson {
    /// The run as data.
    pub fn new(run: &Run<'_>) -> Self {
        let counts = Counts::of_claims(run.judged);
        Self {
            schema: "penetrode/verify/1",
            title: run.suite.title.clone(),
            only: run.suite.only.clone(),
            verdict: counts.verdict(),
            counts,
            claims: run.judged.to_vec(),
            environment: run.environment.clone(),
        }
    }
}

impl StressJson {
    /// The run as data.
    pub fn new(run: &Run<'_>) -> Self {
        let counts = Counts::of_claims(run.judged);
        Self {
            schema: "penetrode/stress/1",
            verdict: counts.verdict(),
            counts,
            claims: run.judged.to_vec(),
            random_scenes: run
                .random
                .map(|(summary, wall_ms)| RandomScenesJson::new(summary, run.environment.seed, wall_ms)),
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
        let methods = summary.tallies.iter().map(|(method, tally)| TallyJson { method: method.name(), tally: *tally });
        let worst = summary.worst.iter().map(|((method, quantity), worst)| WorstJson {
            method: method.name(),
            quantity: quantity.name(),
            ulps: Some(worst.units).filter(|units| units.is_finite()),
            scene: worst.index,
            text: text(worst.index),
        });
        Self { summary: summary.clone(), methods: methods.collect(), worst: worst.collect(), wall_ms }
    }
}
