//! `report.json`: what `verify --json` prints.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Environment, Run};
use crate::suite::{Counts, Judged, Verdict, summary};

/// A judged suite.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VerifyJson {
    /// `penetrode/verify/1`.
    pub schema: &'static str,
    /// Title of the suite.
    pub title: String,
    /// Verdict of the whole.
    pub verdict: Verdict,
    /// How many claims came to what.
    pub counts: Counts,
    /// The claims, in the suite's order.
    pub claims: Vec<ClaimJson>,
    /// Where it ran and what remakes it.
    pub environment: Environment,
}

/// A judged claim.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ClaimJson {
    /// Name.
    pub id: String,
    /// What is claimed.
    pub statement: String,
    /// Scene, where the claim has one.
    pub scene: Option<String>,
    /// Method, where the claim has one.
    pub method: Option<&'static str>,
    /// Quantity, where the claim has one.
    pub quantity: Option<&'static str>,
    /// What became of it.
    pub verdict: Verdict,
    /// Measured value; `null` where there is none, with the reason in `remark`.
    pub measured: Option<f64>,
    /// Largest admissible value.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Why this limit.
    pub reason: String,
    /// What was seen, or why the claim was skipped or failed.
    pub remark: String,
    /// Time spent [ms].
    pub wall_ms: f64,
}

impl From<&Judged> for ClaimJson {
    fn from(judged: &Judged) -> Self {
        let claim = &judged.claim;
        Self {
            id: claim.id.clone(),
            statement: claim.statement.clone(),
            scene: claim.scene.clone(),
            method: claim.method.map(crate::integrators::method::MethodName::name),
            quantity: claim.quantity.map(crate::studies::Quantity::name),
            verdict: judged.verdict,
            measured: judged.measured,
            limit: claim.limit,
            unit: claim.check.unit(),
            reason: claim.reason.clone(),
            remark: judged.remark.clone(),
            wall_ms: judged.wall_ms,
        }
    }
}

impl VerifyJson {
    /// The run as data.
    pub fn new(run: &Run<'_>) -> Self {
        let (verdict, counts) = summary(run.judged);
        Self {
            schema: "penetrode/verify/1",
            title: run.suite.title.clone(),
            verdict,
            counts,
            claims: run.judged.iter().map(ClaimJson::from).collect(),
            environment: run.environment.clone(),
        }
    }
}
