//! A claim: what is stated, for which scenes, methods and quantities, how it is checked, and its limit with the reason.
//!
//! Claims are data. A suite file holds an array of `[[claim]]` tables. A table with several scenes, methods, quantities
//! or rules stands for one claim each (their product), so that a table of orders takes a few lines.

use std::collections::BTreeMap;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::checks::{Asked, Check, Named, PeerName};
use super::verdict::Verdict;
use crate::exchange::scene_file::SHIPPED;
use crate::integrators::central_difference::{Boundaries, VelocityAt};
use crate::integrators::method::MethodName;
use crate::studies::applicability::Line;
use crate::studies::experiments::{Comparison, MarkedScene, grouped};
use crate::studies::order::OrderFit;
use crate::studies::quantity::Quantity;
use crate::studies::rounding::Floor;
use crate::studies::stability::BoundaryPoint;
use crate::studies::sweep::{Conclusion, Plan, Row};

/// One `[[claim]]` table.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClaimSpec {
    /// Name, unique in the suite; `/`-separated from coarse to fine.
    #[schemars(with = "String")]
    pub id: toml::Spanned<String>,
    /// What is claimed, one sentence.
    pub statement: String,
    /// How it is checked.
    #[schemars(with = "Check")]
    pub check: toml::Spanned<Check>,
    /// Section of the report; by default that of the check.
    pub section: Option<Section>,
    /// Scenes: names of shipped scenes, or files beside the suite.
    #[serde(default)]
    #[schemars(schema_with = "scenes")]
    pub scenes: Vec<toml::Spanned<String>>,
    /// Methods.
    #[serde(default)]
    pub methods: Vec<MethodName>,
    /// Quantities.
    #[serde(default)]
    pub quantities: Vec<Quantity>,
    /// Velocity rules of the central difference.
    #[serde(default)]
    pub velocities: Vec<VelocityAt>,
    /// Boundary rules of the central difference.
    #[serde(default)]
    pub boundaries: Vec<Boundaries>,
    /// Largest admissible measured value, in the unit of the check.
    #[schemars(with = "f64", range(min = 0.0))]
    pub limit: toml::Spanned<f64>,
    /// Why this limit and no other.
    pub reason: String,
}

/// Schema of the scenes of a claim.
fn scenes(_: &mut SchemaGenerator) -> Schema {
    let shipped: Vec<_> = SHIPPED.iter().map(|(name, _)| *name).collect();
    json_schema!({
        "type": "array",
        "items": { "anyOf": [{ "enum": shipped }, { "type": "string", "pattern": "\\.toml$" }] },
    })
}

/// The section of a report that shows a claim or a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Section {
    /// What is solved.
    Model,
    /// Exact answers and formulas.
    Exact,
    /// Orders of convergence.
    Orders,
    /// Exact discrete solutions and error constants.
    Constants,
    /// Error estimates where nothing exact is known.
    Solution,
    /// Other methods and other programs.
    CrossCode,
    /// Events and outcomes.
    Events,
    /// Energy and other invariants.
    Energy,
    /// Stability and rounding.
    Stability,
    /// The paper's curve over the thickness.
    Slab,
    /// Where Eq. 11-12 holds.
    Applicability,
    /// Measured depths.
    Measured,
    /// Targets of layers.
    Layers,
    /// Sensitivities.
    Sensitivities,
    /// What an accuracy costs.
    Cost,
    /// Step sizes, range, rounding and stiffness at the edges.
    Steps,
    /// The search for the critical velocity at the edges.
    Critical,
    /// Random scenes by the million.
    Random,
    /// From the text of a scene to its stages.
    Input,
    /// What commands print.
    Commands,
    /// The judge itself.
    Judge,
}

/// One claim: a table's claim for one scene, method, quantity and rule.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Claim {
    /// Name.
    pub id: String,
    /// Name of its table, shared by the claims that differ only in scene, method, quantity or rule.
    #[serde(skip)]
    pub table: String,
    /// What is claimed.
    pub statement: String,
    /// How it is checked.
    #[serde(skip)]
    pub check: Check,
    /// Section of the report that shows it.
    #[serde(skip)]
    pub section: Section,
    /// Scene, where the claim has one.
    pub scene: Option<String>,
    /// Method, where the claim has one.
    #[schemars(with = "Option<String>")]
    pub method: Option<MethodName>,
    /// Quantity, where the claim has one.
    #[schemars(with = "Option<String>")]
    pub quantity: Option<Quantity>,
    /// Velocity rule, where the claim has one.
    #[serde(skip)]
    pub velocity: Option<VelocityAt>,
    /// Boundary rule, where the claim has one.
    #[serde(skip)]
    pub boundaries: Option<Boundaries>,
    /// Largest admissible value.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Why this limit.
    pub reason: String,
}

impl Claim {
    /// The unit in words that say what the number is of: `0.03 off the formal order`.
    pub fn unit_in_words(&self) -> &'static str {
        in_words(self.unit)
    }

    /// The rules of the scheme, where the check asks for them.
    pub fn rules(&self) -> (VelocityAt, Boundaries) {
        (self.velocity.unwrap_or_default(), self.boundaries.unwrap_or_default())
    }

    /// The first of what the claim names, with its key, that its check has not `asked` for: it would measure the same without.
    pub(super) fn not_asked(&self, asked: &Asked) -> Option<(&'static str, String)> {
        let about = |method: &MethodName| self.check.is_about(*method);
        let named = [
            (Named::Scene, "scenes", self.scene.clone()),
            (Named::Method, "methods", self.method.filter(|method| !about(method)).map(|method| method.to_string())),
            (Named::Quantity, "quantities", self.quantity.map(|quantity| quantity.to_string())),
            (Named::Velocity, "velocities", self.velocity.map(|rule| rule.to_string())),
            (Named::Boundaries, "boundaries", self.boundaries.map(|rule| rule.to_string())),
        ];
        let mut not_asked = named.into_iter().filter(|(part, ..)| !asked.has(*part));
        not_asked.find_map(|(_, key, name)| Some((key, name?)))
    }

    /// First part of the id, by which reports group claims.
    pub fn group(&self) -> &str {
        self.id.split('/').next().unwrap_or(&self.id)
    }
}

impl ClaimSpec {
    /// The claims of the table: the product of its scenes, methods, quantities and rules.
    pub fn expand(&self) -> Vec<Claim> {
        let check = self.check.get_ref();
        let claim = Claim {
            id: self.id.get_ref().clone(),
            table: self.id.get_ref().clone(),
            statement: self.statement.clone(),
            check: check.clone(),
            section: self.section.unwrap_or(check.section()),
            scene: None,
            method: None,
            quantity: None,
            velocity: None,
            boundaries: None,
            limit: *self.limit.get_ref(),
            unit: check.unit(),
            reason: self.reason.clone(),
        };
        let stem = |name: &toml::Spanned<String>| {
            let stem = name.get_ref().trim_end_matches(".toml");
            stem.rsplit('/').next().unwrap_or(stem).to_owned()
        };
        let claims = varied(&[claim], &self.scenes, stem, |claim, name| claim.scene = Some(name.get_ref().clone()));
        let claims = varied(&claims, &self.velocities, ToString::to_string, |claim, rule| claim.velocity = Some(*rule));
        let claims =
            varied(&claims, &self.boundaries, ToString::to_string, |claim, rule| claim.boundaries = Some(*rule));
        let claims = varied(&claims, &self.methods, ToString::to_string, |claim, name| claim.method = Some(*name));
        varied(&claims, &self.quantities, ToString::to_string, |claim, name| claim.quantity = Some(*name))
    }
}

/// Units of numbers of things.
pub(super) const THINGS: [&str; 17] = [
    "families",
    "claims",
    "violations",
    "differences",
    "defects",
    "faults",
    "schemes",
    "solvers",
    "changes",
    "points outside",
    "refuted",
    "wrong outcomes",
    "wrong answers",
    "wrong verdicts",
    "wrong exit codes",
    "lines that differ",
    "contradictions",
];

/// A unit of a check in words that say what a number is of.
fn in_words(unit: &'static str) -> &'static str {
    match unit {
        "relative x condition" => "relative, over the conditioning",
        "ulp x condition" => "ulp, over the conditioning",
        "promises" => "times the promised error",
        "promises x condition" => "times the promised error, over the conditioning",
        "order" => "off the formal order",
        "S" => "S off the jump stated",
        "tolerance" => "times the tolerance",
        "uncertainty" => "times the uncertainty stated",
        "error bars" | "error/bar" => "times the error bar",
        "error bounds" => "times the error bound",
        "bound/error" => "times the error",
        "error/rtol" => "times the tolerance asked for",
        "compensated/plain" => "of the rounding of plain sums",
        "quotient" => "times the bound of one scene alone",
        "digits" => "digits lost",
        "slope of cost" => "as slope of the cost",
        "families" => "families of claims that lack some",
        "claims" => "claims whose computations share more",
        _ => unit,
    }
}

/// How many cases `judged` were measured on, where what they measure is a number of things.
pub fn of_cases<'a>(judged: impl IntoIterator<Item = &'a Judged>) -> Option<usize> {
    let counted = judged.into_iter().filter(|judged| THINGS.contains(&judged.claim.unit));
    let cases = counted.map(|judged| judged.cases).sum();
    (cases > 1).then_some(cases)
}

/// Each of `claims` once for each of `values`, by `set`; where there are several, the id ends with the name of the value.
fn varied<T>(claims: &[Claim], values: &[T], name: impl Fn(&T) -> String, set: impl Fn(&mut Claim, &T)) -> Vec<Claim> {
    if values.is_empty() {
        return claims.to_vec();
    }
    let pairs = claims.iter().flat_map(|claim| values.iter().map(move |value| (claim, value)));
    pairs
        .map(|(claim, value)| {
            let mut claim = claim.clone();
            if values.len() > 1 {
                claim.id = format!("{}/{}", claim.id, name(value));
            }
            set(&mut claim, value);
            claim
        })
        .collect()
}

/// What a check found.
#[derive(Clone, Debug)]
#[must_use]
pub struct Measurement {
    /// Measured value in the unit of the check.
    pub value: f64,
    /// Half-width of what the measurement can resolve, one ulp at least; a limit is loose relative to the larger of the
    /// two, and none is to a count, which resolves nothing.
    pub resolution: f64,
    /// The verdict, where it is not simply `value <= limit`.
    pub verdict: Option<Verdict>,
    /// What was seen, in words, for the report.
    pub remark: String,
    /// Data behind it, for the figures.
    pub evidence: Option<Evidence>,
    /// How many cases it was measured on: scenes, steps, expectations.
    pub cases: usize,
}

impl Measurement {
    /// A plain measurement of one case.
    pub fn new(value: f64) -> Self {
        Self { value, resolution: f64::EPSILON, verdict: None, remark: String::new(), evidence: None, cases: 1 }
    }

    /// Measured on so many cases.
    pub fn cases(self, cases: usize) -> Self {
        Self { cases, ..self }
    }

    /// A number of things, to which no limit is loose.
    pub fn count(number: usize) -> Self {
        Self::new(number as f64).resolving(f64::INFINITY)
    }

    /// With what it can resolve.
    pub fn resolving(self, resolution: f64) -> Self {
        Self { resolution: resolution.max(f64::EPSILON), ..self }
    }

    /// With words for the report.
    pub fn remark(self, remark: impl Into<String>) -> Self {
        Self { remark: remark.into(), ..self }
    }

    /// With data for the figures.
    pub fn evidence(self, evidence: Evidence) -> Self {
        Self { evidence: Some(evidence), ..self }
    }
}

/// What measuring a claim, or a part of it, gives.
pub type Found<T = Measurement> = Result<T, NotMeasured>;

/// Why a claim has no measurement, and the verdict that follows.
#[derive(Clone, Debug, PartialEq)]
pub struct NotMeasured {
    verdict: Verdict,
    reason: String,
    /// Whether it would be measured by a complete build on a complete machine.
    lacks: bool,
}

impl NotMeasured {
    /// The claim does not apply: it is skipped.
    pub fn skip(reason: impl Into<String>) -> Self {
        Self { verdict: Verdict::Skipped, reason: reason.into(), lacks: false }
    }

    /// This build or this run lacks what the claim needs: it is skipped.
    pub fn lacks(reason: impl Into<String>) -> Self {
        Self { lacks: true, ..Self::skip(reason) }
    }

    /// Whether the claim does not apply.
    pub(super) fn is_skipped(&self) -> bool {
        self.verdict == Verdict::Skipped
    }

    /// The measurement cannot decide.
    pub fn undecided(reason: impl Into<String>) -> Self {
        Self { verdict: Verdict::Undecided, reason: reason.into(), lacks: false }
    }

    /// The measurement itself failed: the claim fails.
    pub fn broken(reason: impl fmt::Display) -> Self {
        Self { verdict: Verdict::Failed, reason: reason.to_string(), lacks: false }
    }
}

impl<E: std::error::Error> From<E> for NotMeasured {
    /// An error of what is measured: the claim fails.
    fn from(error: E) -> Self {
        Self::broken(error)
    }
}

/// Data behind a measurement.
#[derive(Clone, Debug)]
pub enum Evidence {
    /// A fitted power law.
    Fit {
        /// Order expected.
        formal: f64,
        /// The fit with every point.
        fit: Box<OrderFit>,
    },
    /// Values over an abscissa.
    Series(Vec<(f64, f64)>),
    /// A sweep of H/d.
    Sweep {
        /// Scene and axis.
        plan: Box<Plan>,
        /// Its points.
        rows: Vec<Row>,
    },
    /// What becomes of a conclusion of the paper.
    Conclusion(Conclusion),
    /// Measured depths beside their predictions.
    Depths(Vec<Comparison>),
    /// The map of Eq. 11-12 for one k.
    Map {
        /// Crater depth in diameters.
        crater_ratio: f64,
        /// Lines of equal error.
        lines: Vec<Line>,
        /// Experiments on it.
        scenes: Vec<MarkedScene>,
    },
    /// The boundary of stability.
    Boundary(Vec<BoundaryPoint>),
    /// Errors against the number of steps.
    Rounding(Vec<Floor>),
}

/// A judged claim.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[schemars(rename = "ClaimJson")]
pub struct Judged {
    /// The claim.
    #[serde(flatten)]
    pub claim: Claim,
    /// What became of it.
    pub verdict: Verdict,
    /// Measured value; `null` where there is none, with the reason in `remark`.
    pub measured: Option<f64>,
    /// Half-width of what the measurement can resolve.
    #[serde(skip)]
    pub resolution: f64,
    /// What was seen, or why the claim was skipped or failed.
    pub remark: String,
    /// Data for the figures.
    #[serde(skip)]
    pub evidence: Option<Evidence>,
    /// How many cases it was measured on.
    #[serde(skip)]
    pub cases: usize,
    /// Whether it was skipped since this build or this run lacks something.
    #[serde(skip)]
    pub lacks: bool,
    /// Time spent (ms).
    pub wall_ms: f64,
}

impl Judged {
    /// `claim` with what its check found in `wall_ms` (ms).
    pub fn new(claim: Claim, found: Found, wall_ms: f64) -> Self {
        let lacks = found.as_ref().is_err_and(|lack| lack.lacks);
        let found = found.and_then(|measured| match measured.cases {
            0 => Err(NotMeasured::broken("measured on no case at all")),
            _ => Ok(measured),
        });
        let Measurement { value, resolution, verdict, remark, evidence, cases } = found.unwrap_or_else(|lack| {
            Measurement { verdict: Some(lack.verdict), ..Measurement::new(f64::NAN).remark(lack.reason).cases(0) }
        });
        let verdict = verdict.unwrap_or_else(|| Verdict::of(value, claim.limit));
        let measured = Some(value).filter(|value| value.is_finite());
        Self { claim, verdict, measured, resolution, remark, evidence, cases, lacks, wall_ms }
    }

    /// Whether the claim failed or is undecided.
    pub fn is_open(&self) -> bool {
        matches!(self.verdict, Verdict::Failed | Verdict::Undecided)
    }

    /// How many times looser the limit is than what was measured, taken as at least one ulp and as at least what the
    /// measurement resolves.
    ///
    /// `None` where nothing was measured, for counts and limits of zero, and for a program given with `--peer`: no limit
    /// of a suite knows how good it is.
    pub fn looseness(&self) -> Option<f64> {
        let is_given = matches!(&self.claim.check, Check::Peer(peer) if peer.name == PeerName::User);
        let is_decisive = self.claim.limit > 0.0 && self.resolution.is_finite() && !is_given;
        self.measured.filter(|_| is_decisive).map(|measured| self.claim.limit / measured.max(self.resolution))
    }
}

/// Largest looseness of a limit that still guards something.
pub const LOOSENESS_MAX: f64 = 100.0;

/// The claims of each table of the suite together, in its order.
pub fn tables(judged: &[Judged]) -> impl Iterator<Item = &[Judged]> {
    judged.chunk_by(|a, b| a.claim.table == b.claim.table)
}

/// Why claims were skipped, each reason once with the number of claims.
pub fn skipped(judged: &[Judged]) -> Vec<(&str, usize)> {
    let skipped = judged.iter().filter(|j| j.verdict == Verdict::Skipped);
    let groups = grouped(skipped, |judged| judged.remark.as_str()).into_iter();
    groups.map(|(reason, claims)| (reason, claims.len())).collect()
}

/// The largest measured value.
pub fn worst(judged: &[Judged]) -> Option<f64> {
    judged.iter().filter_map(|j| j.measured).max_by(f64::total_cmp)
}

/// Looseness of each table that has one: a table has one limit, so the least of its claims decides.
pub fn looseness(judged: &[Judged]) -> BTreeMap<&str, f64> {
    let mut least = BTreeMap::new();
    for judged in judged {
        if let Some(looseness) = judged.looseness() {
            let entry = least.entry(judged.claim.table.as_str()).or_insert(f64::INFINITY);
            *entry = looseness.min(*entry);
        }
    }
    least
}
