//! A claim: what is said, of which scenes, methods and quantities, how it is checked, and its limit with the reason.
//!
//! Claims are data. A suite file holds an array of `[[claim]]` tables; one table with several scenes, methods or
//! quantities stands for one claim each (their product), so that a table of orders is a few lines.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;

use crate::integrators::central_difference::{Boundaries, VelocityAt};
use crate::integrators::method::MethodName;
use crate::studies::applicability::Line;
use crate::studies::experiments::{Comparison, MarkedScene};
use crate::studies::order::OrderFit;
use crate::studies::quantity::Quantity;
use crate::studies::rounding::Floor;
use crate::studies::stability::BoundaryPoint;
use crate::studies::sweep::{Plan, Row};

use super::verdict::Verdict;

/// One `[[claim]]` table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClaimSpec {
    /// Name, unique in the suite; `/`-separated from coarse to fine.
    pub id: toml::Spanned<String>,
    /// What is claimed, one sentence.
    pub statement: String,
    /// How it is checked.
    pub check: toml::Spanned<Check>,
    /// Scenes: names of shipped scenes, or files beside the suite.
    #[serde(default)]
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
    pub limit: toml::Spanned<f64>,
    /// Why this limit and no other.
    pub reason: String,
}

/// How a claim is checked. Each kind states its measured value and unit.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Check {
    /// Closed form against the 50-digit reference, over the scenes and `random` more drawn from the seed; worst
    /// error in ulp over max(1, condition number).
    Reference {
        /// Random scenes besides those named.
        #[serde(default)]
        random: usize,
    },
    /// Method against the exact answer; relative error over max(1, condition number).
    Agreement {
        /// Relative tolerance of the method.
        rtol: Option<f64>,
    },
    /// The claim's quantity of its scene against a number stated in the suite: published, measured, or computed
    /// elsewhere; relative difference.
    Stated {
        /// The number, in SI units.
        value: f64,
    },
    /// Exit margin and outcome against 50 digits at `points` impact speeds from a fifth of the critical velocity to
    /// five times it: worst error of the margin over its error bar. A wrong outcome that is not `undecided` breaks it.
    Margin {
        /// How many, log-uniform from the seed.
        points: usize,
    },
    /// Central difference: worst relative distance of the time of step i from i dt, over `steps` steps.
    Clock {
        /// How many steps.
        steps: usize,
    },
    /// N* and height of every nose shape against the integral and the circle that they stand for; worst relative
    /// difference.
    Nose {},
    /// Roache's GCI and Richardson's extrapolation on three runs of the central difference against the true error:
    /// worst of |GCI/(1.25 |error|) - 1|, |extrapolated error/error|, and the distance of Celik's order from the formal
    /// one over it.
    GridConvergence {},
    /// Central difference at rest in the crater, step ends: how far (X(dt)/X - 1)/(w dt)² leaves 0 to 1/8, over many
    /// steps, and how far its extremes stay inside; relative to 1/8.
    CraterBand {},
    /// Outcome of the method; 0 when right or undecided, 1 when wrong.
    Outcome {
        /// Name of the outcome in the contract.
        is: String,
    },
    /// Method at Q = 0 and continuous c against Eq. 11-12, `points` impact functions I from `from` to `to`; worst
    /// relative difference of X/d.
    SmallImpact {
        /// Smallest I.
        from: f64,
        /// Largest I.
        to: f64,
        /// How many, log-uniform from the seed.
        points: usize,
    },
    /// X/d at finite N against Eq. 11-12 as N grows: distance of the fitted order in 1/N from 1.
    ApproachOrder {
        /// Impact function I; its side of k pi/4 decides between Eq. 11 and Eq. 12.
        impact: f64,
    },
    /// The same: relative distance of the constant from theory section 3.
    ApproachConstant {
        /// Impact function I.
        impact: f64,
    },
    /// Eq. 15 against Eq. 11-12 with the ACE/NDRC relation over H/d; worst relative difference.
    Eq15 {
        /// `unrounded` or `printed`.
        form: Eq15Form,
        /// Smallest H/d.
        from: f64,
        /// Largest H/d.
        to: f64,
    },
    /// Jump of Eq. 15 at a joint, in units of S: distance from the stated one.
    Eq15Jump {
        /// `unrounded` or `printed`.
        form: Eq15Form,
        /// The joint H/d.
        at: f64,
        /// Stated jump in units of S.
        jump: f64,
    },
    /// Critical velocity with the NDRC criterion and Q = 0 against unrounded Eq. 15; worst relative difference.
    NdrcCriterion {
        /// How many H/d, log-uniform from the seed.
        points: usize,
    },
    /// Central difference: distance of the fitted order from `order`.
    Order {
        /// Order expected.
        order: f64,
        /// Pattern of the steps.
        #[serde(default)]
        steps: StepPattern,
        /// How many step sizes.
        #[serde(default = "default_points")]
        points: usize,
    },
    /// Central difference in the crater or at Q = 0: worst distance from the exact discrete solution over the amplitude.
    DiscreteSolution {
        /// w dt in the crater; in the tunnel dt over the tunnel time.
        step: f64,
        /// Number of steps at most.
        steps: usize,
    },
    /// Central difference at rest in the crater: relative distance of error/(w dt)² from 1/8 (depth) or -1/24 (time).
    CraterConstant {},
    /// Lagged drag: relative distance of error/dt from the modified equation's constant.
    LaggedConstant {},
    /// Kinetic energy lost against work done, along the whole path; worst residual over M V0²/2.
    EnergyBalance {},
    /// From the end of a perforation back to the face; relative distance from V0.
    TimeReversal {},
    /// The scene scaled in length, mass and time; relative change of the depth and time in scaled units.
    Similarity {
        /// Factor of length.
        length: f64,
        /// Factor of mass.
        mass: f64,
        /// Factor of time.
        time: f64,
    },
    /// Every stage cut into pieces and restarted; relative change of the quantity.
    Split {
        /// Pieces of a stage.
        pieces: usize,
    },
    /// Central difference on a manufactured solution; distance of the fitted order from `order`.
    Manufactured {
        /// `smooth` or `kink`.
        path: ManufacturedPath,
        /// Order expected.
        order: f64,
    },
    /// One method against another; difference over the sum of their tolerances.
    Pair {
        /// The other method.
        with: MethodName,
        /// Tolerance that each may claim, relative.
        tolerance: f64,
    },
    /// Central difference of undamped crater motion: |w dt - 2|/2 at which growth sets in.
    StabilityLimit {},
    /// Error against tolerance: distance of the slope from 1.
    Proportionality {
        /// Largest tolerance.
        from: f64,
        /// Smallest tolerance.
        to: f64,
    },
    /// Error against work: distance of the slope of error over 1/evaluations from the order of the method.
    WorkOrder {
        /// Largest tolerance.
        from: f64,
        /// Smallest tolerance.
        to: f64,
    },
    /// Self-convergence without the exact answer: its error over its own uncertainty.
    SelfConvergence {},
    /// Events in time order, each at its place, none missing or twice; number of violations.
    EventOrder {},
    /// Critical velocity and energies of every point of a sweep of H/d against the closed form of a scene built for that
    /// point alone; worst relative difference.
    Sweep {
        /// Smallest H/d.
        from: f64,
        /// Largest H/d.
        to: f64,
        /// How many, evenly.
        points: usize,
    },
    /// Depth flown on the lines of equal error of Eq. 11-12: worst relative distance of its error from that of the line.
    Map {
        /// How many places of each line.
        points: usize,
    },
    /// Median of predicted over measured depth of each set of the shipped data, shallow shots apart: worst distance
    /// from 1.
    MeasuredDepth {},
    /// Elasticities of every quantity to every number of the scene, by the method against the closed form in dual
    /// numbers: worst difference, relative to those above 1.
    Sensitivities {},
    /// Central difference: worst relative distance of the measured boundary of stability in w dt from the theoretical
    /// one over the drag group Q V dt/M.
    StabilityMap {
        /// How many drag groups, for each velocity rule.
        points: usize,
    },
    /// Central difference: rounding error of the depth with compensated sums over that with plain ones, after
    /// 2^`from` to 2^`to` steps; nothing unless truncation falls at second order.
    RoundingFloor {
        /// Power of two of the fewest steps.
        from: u32,
        /// Power of two of the most steps.
        to: u32,
    },
    /// Answers of another program; difference over the tolerance.
    Peer {
        /// Name of the recorded peer, or `user` for the one given on the command line.
        name: String,
        /// Relative tolerance claimed.
        tolerance: f64,
    },
}

fn default_points() -> usize {
    60
}

/// Which coefficients of Eq. 15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Eq15Form {
    /// As printed in the paper.
    Printed,
    /// Before rounding.
    Unrounded,
}

/// How the steps of one run are laid out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StepPattern {
    /// All equal.
    #[default]
    Uniform,
    /// Slowly varying.
    Smooth,
    /// Long and short in turn.
    Alternating,
    /// Drawn from the seed.
    Random,
}

/// Which manufactured path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ManufacturedPath {
    /// One stage.
    Smooth,
    /// Through x = k d at a known time.
    Kink,
}

impl Check {
    /// Unit of the measured value and of the limit.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Reference { .. } => "ulp x condition",
            Self::Agreement { .. } => "relative x condition",
            Self::Outcome { .. } => "wrong outcomes",
            Self::EventOrder {} => "violations",
            Self::ApproachOrder { .. }
            | Self::Order { .. }
            | Self::Manufactured { .. }
            | Self::Proportionality { .. }
            | Self::WorkOrder { .. } => "order",
            Self::Eq15Jump { .. } => "S",
            Self::Pair { .. } | Self::Peer { .. } => "tolerance",
            Self::SelfConvergence {} => "uncertainty",
            Self::Margin { .. } => "error bars",
            Self::RoundingFloor { .. } => "compensated/plain",
            _ => "relative",
        }
    }

    /// One ulp in the unit of the check: no measurement is believed to be finer.
    pub fn resolution(&self) -> f64 {
        match self {
            Self::Reference { .. } | Self::Outcome { .. } | Self::EventOrder {} => 1.0,
            Self::Pair { tolerance, .. } | Self::Peer { tolerance, .. } => f64::EPSILON / tolerance,
            _ => f64::EPSILON,
        }
    }
}

/// One claim: a table's claim for one scene, method and quantity.
#[derive(Clone, Debug)]
pub struct Claim {
    /// Name, unique.
    pub id: String,
    /// Name of its table, which it shares with the claims that differ in scene, method, quantity or rule alone.
    pub table: String,
    /// What is claimed.
    pub statement: String,
    /// How it is checked.
    pub check: Check,
    /// Scene, where the check has one.
    pub scene: Option<String>,
    /// Method, where the check has one.
    pub method: Option<MethodName>,
    /// Quantity, where the check has one.
    pub quantity: Option<Quantity>,
    /// Velocity rule, where the check has one.
    pub velocity: VelocityAt,
    /// Boundary rule, where the check has one.
    pub boundaries: Boundaries,
    /// Largest admissible measured value.
    pub limit: f64,
    /// Why this limit.
    pub reason: String,
}

impl ClaimSpec {
    /// The claims of the table: the product of its scenes, methods, quantities and rules.
    pub fn expand(&self) -> Vec<Claim> {
        fn axis<T: Clone>(values: &[T]) -> Vec<Option<T>> {
            if values.is_empty() { vec![None] } else { values.iter().cloned().map(Some).collect() }
        }
        let mut claims = Vec::new();
        for scene in axis(&self.scenes) {
            for velocity in axis(&self.velocities) {
                for boundaries in axis(&self.boundaries) {
                    for method in axis(&self.methods) {
                        for quantity in axis(&self.quantities) {
                            let mut id = self.id.get_ref().clone();
                            let mut suffix = |part: &dyn fmt::Display, many: bool| {
                                if many {
                                    id.push_str(&format!("/{part}"));
                                }
                            };
                            if let Some(scene) = &scene {
                                let stem = scene.get_ref().trim_end_matches(".toml");
                                let stem = stem.rsplit('/').next().unwrap_or(stem);
                                suffix(&stem, self.scenes.len() > 1);
                            }
                            if let Some(velocity) = velocity {
                                suffix(&velocity, self.velocities.len() > 1);
                            }
                            if let Some(boundaries) = boundaries {
                                suffix(&boundaries, self.boundaries.len() > 1);
                            }
                            if let Some(method) = method {
                                suffix(&method, self.methods.len() > 1);
                            }
                            if let Some(quantity) = quantity {
                                suffix(&quantity.name(), self.quantities.len() > 1);
                            }
                            claims.push(Claim {
                                id,
                                table: self.id.get_ref().clone(),
                                statement: self.statement.clone(),
                                check: self.check.get_ref().clone(),
                                scene: scene.as_ref().map(|s| s.get_ref().clone()),
                                method,
                                quantity,
                                velocity: velocity.unwrap_or_default(),
                                boundaries: boundaries.unwrap_or_default(),
                                limit: *self.limit.get_ref(),
                                reason: self.reason.clone(),
                            });
                        }
                    }
                }
            }
        }
        claims
    }
}

/// What a check found.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Measured value in the unit of the check.
    pub value: f64,
    /// Half-width of what the measurement can resolve; a limit is loose relative to the larger of the two.
    pub resolution: f64,
    /// The verdict, where it is not simply `value <= limit`.
    pub verdict: Option<Verdict>,
    /// What was seen, in words, for the report.
    pub remark: String,
    /// Data behind it, for the figures.
    pub evidence: Option<Evidence>,
}

impl Measurement {
    /// A plain measurement.
    pub fn new(value: f64) -> Self {
        Self { value, resolution: 0.0, verdict: None, remark: String::new(), evidence: None }
    }

    /// With words for the report.
    #[must_use]
    pub fn remark(mut self, remark: impl Into<String>) -> Self {
        self.remark = remark.into();
        self
    }

    /// With data for the figures.
    #[must_use]
    pub fn evidence(mut self, evidence: Evidence) -> Self {
        self.evidence = Some(evidence);
        self
    }

    /// With a verdict of its own.
    #[must_use]
    pub fn verdict(mut self, verdict: Verdict) -> Self {
        self.verdict = Some(verdict);
        self
    }

    /// With what it can resolve.
    #[must_use]
    pub fn resolution(mut self, resolution: f64) -> Self {
        self.resolution = resolution;
        self
    }
}

/// Why a claim has no measurement.
#[derive(Clone, Debug, PartialEq)]
pub enum NotMeasured {
    /// It does not apply: skipped, with the reason.
    NotApplicable(String),
    /// The measurement itself failed: the claim fails.
    Broken(String),
}

impl NotMeasured {
    /// The claim does not apply.
    pub fn skip(reason: impl Into<String>) -> Self {
        Self::NotApplicable(reason.into())
    }

    /// The measurement failed.
    pub fn broken(reason: impl fmt::Display) -> Self {
        Self::Broken(reason.to_string())
    }
}

/// Data behind a measurement.
#[derive(Clone, Debug)]
pub enum Evidence {
    /// A fitted power law.
    Fit {
        /// What the abscissa is: `dt_s`, `rtol`, `1/evaluations`, `1/N`.
        abscissa: &'static str,
        /// Order expected.
        formal: f64,
        /// The fit with every point.
        fit: Box<OrderFit>,
    },
    /// Values over an abscissa.
    Series {
        /// Name of the abscissa with its unit.
        abscissa: &'static str,
        /// Name of the ordinate with its unit.
        ordinate: &'static str,
        /// Points.
        points: Vec<(f64, f64)>,
    },
    /// A sweep of H/d.
    Sweep {
        /// Scene and axis.
        plan: Box<Plan>,
        /// Its points.
        rows: Vec<Row>,
    },
    /// Measured shots beside their predictions.
    Depths(Vec<Comparison>),
    /// The map of Eq. 11-12 for one k.
    Map {
        /// Crater depth in diameters.
        crater_ratio: f64,
        /// Lines of equal error.
        lines: Vec<Line>,
        /// Measured shots on it.
        scenes: Vec<MarkedScene>,
    },
    /// The boundary of stability.
    Boundary(Vec<BoundaryPoint>),
    /// Errors against the number of steps.
    Rounding(Vec<Floor>),
}

/// A claim and what became of it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The claim.
    pub claim: Claim,
    /// What became of it.
    pub verdict: Verdict,
    /// Measured value; `None` where nothing was measured or it is not a number.
    pub measured: Option<f64>,
    /// Half-width of what the measurement can resolve.
    pub resolution: f64,
    /// What was seen, or why it was skipped or failed.
    pub remark: String,
    /// Data for the figures.
    pub evidence: Option<Evidence>,
    /// Time spent [ms].
    pub wall_ms: f64,
}

impl Judged {
    /// How many times looser the limit is than what was measured, taken as at least one ulp and as at least what the
    /// measurement resolves.
    ///
    /// `None` where nothing was measured, and for counts and limits of zero.
    pub fn looseness(&self) -> Option<f64> {
        if self.claim.limit == 0.0 || matches!(self.claim.check, Check::Outcome { .. } | Check::EventOrder {}) {
            return None;
        }
        let floor = self.resolution.max(self.claim.check.resolution());
        self.measured.map(|m| self.claim.limit / m.max(floor))
    }
}

/// Largest looseness of a limit that still guards something.
pub const LOOSENESS_MAX: f64 = 100.0;

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
