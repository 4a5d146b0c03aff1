//! What is said of a table: its columns, their rows, what was remarked, and what the judgement is made against.

use std::str::FromStr;

use serde::Serialize;

use super::column::Column;
use crate::studies::grid_convergence::{EcaHoekstra, ThreeGrids, Uncertainty};
use crate::studies::limit::SecondTerm;
use crate::studies::order::{Class, Exclusion, PowerLaw};
use crate::studies::quantity::Quantity;
use crate::studies::scheme_of_table::Identification;
use crate::studies::verdict::Verdict;

/// An interval of the order that reaches this far has no end there.
pub(super) const ORDER_SHOWN: f64 = 9.9;

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// Rows were out of order, and are sorted.
    Unsorted,
    /// Rows said the same twice, and are merged.
    DuplicateRows,
    /// A column without any value is left out.
    EmptyColumn,
    /// A column that counts the steps of a run is left out.
    StepCount,
    /// NaN or infinity.
    NotFinite,
    /// The values do not depend on the step.
    Constant,
    /// The errors are zero or round-off.
    ZeroError,
    /// No law stands out from chance.
    Noise,
    /// The values run away.
    Diverging,
    /// The values alternate.
    Oscillating,
    /// The order is not the one asked for.
    OrderMissed,
    /// The order asked for cannot be distinguished from its neighbours.
    OrderUnclear,
    /// The finest value does not follow the law of the others.
    StrayRow,
    /// Each step is longer than the flight of the scene.
    LongSteps,
    /// The values approach something else than the exact value.
    WrongLimit,
    /// The scene does not have the quantity.
    Absent,
}

/// One remark about the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Finding {
    /// What it is about.
    pub kind: FindingKind,
    /// Column it concerns; `null` for the whole table.
    pub quantity: Option<Column>,
    /// The remark, one sentence with its numbers.
    pub message: String,
}

/// What the exact solution says of a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exact {
    /// Nothing.
    #[default]
    Unknown,
    /// Its value, which depends on the scene alone.
    Free(f64),
    /// Its value, which the outcome fixes: H as depth of an exit, zero as velocity at rest.
    Fixed(f64),
    /// That there is none, and why: one clause.
    Absent(&'static str),
}

/// The exact solution, to compare a table with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExactValues {
    /// Impact velocity V0 (m/s): every velocity error is relative to it.
    pub impact_velocity: f64,
    /// Whether the projectile comes to rest.
    pub stops: bool,
    /// What it says of each quantity, in the order of [`Quantity::ALL`].
    pub values: [Exact; Quantity::ALL.len()],
    /// Two numbers between which each is proved to lie, in the same order.
    pub proved: [Option<(f64, f64)>; Quantity::ALL.len()],
}

impl ExactValues {
    /// What the errors of a quantity with the exact `value` are relative to; `None` where that is zero.
    pub(super) fn scale(&self, quantity: Quantity, value: f64) -> Option<f64> {
        let is_velocity = quantity.is_over_impact_speed() || quantity == Quantity::CriticalVelocity;
        let scale = if is_velocity { self.impact_velocity } else { value };
        (value.is_finite() && scale.is_finite() && scale != 0.0).then_some(scale.abs())
    }

    /// What a code computes whose `quantity` tends to `limit` and not to `exact`.
    pub(super) fn outcome_of(&self, quantity: Quantity, limit: f64, exact: f64) -> &'static str {
        let ratio = limit / exact;
        match (quantity, self.stops) {
            _ if (ratio + 1.0).abs() < 0.1 => "its sign is the other one",
            _ if [1e3, 1e-3, 1e6, 1e-6].iter().any(|unit| (ratio / unit - 1.0).abs() < 0.1) => {
                "is its unit another one?"
            }
            (Quantity::Depth, false) if limit < exact => "it comes to rest where the scene is perforated",
            (Quantity::Depth, false) => "its depth lies beyond the far side, where the scene has been left",
            (Quantity::Velocity, true) => "it leaves where the projectile of the scene comes to rest",
            (Quantity::Velocity, false) if limit <= 0.0 => "it comes to rest where the scene is perforated",
            _ => "it computes another scene, another law, or takes the value at another place",
        }
    }
}

/// One row of one column.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct AuditPoint {
    /// Step (s).
    pub dt_s: f64,
    /// Value in the table; NaN and infinity are `null` in JSON.
    #[cfg_attr(feature = "report", schemars(with = "Option<f64>"))]
    pub value: f64,
    /// Size of its error, relative as in `converge`: against the exact value, else against the limit found; `null`
    /// where there is neither.
    pub error: Option<f64>,
    /// Whether the order rests on it.
    pub used: bool,
    /// Why not.
    pub excluded: Option<Exclusion>,
}

/// The value at the finest step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Finest {
    /// Step (s).
    pub dt_s: f64,
    /// Value; NaN and infinity are `null` in JSON.
    #[cfg_attr(feature = "report", schemars(with = "Option<f64>"))]
    pub value: f64,
}

/// The error bar of the finest value that the verdict shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct ErrorBand {
    /// Half-width, in the unit of the value.
    pub half_width: f64,
    /// Name of the rule.
    pub rule: &'static str,
}

/// The judgement of one column.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct QuantityAudit {
    /// Which quantity, or the name of another column.
    pub quantity: Column,
    /// The value that the error bar belongs to.
    pub finest: Finest,
    /// Its error bar; `null` for values that diverge.
    pub error_band: Option<ErrorBand>,
    /// Order expected, if one was given.
    pub formal_order: Option<f64>,
    /// Order found.
    pub observed_order: Option<f64>,
    /// Its 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Its interval at [`AUDIT_LEVEL`](super::AUDIT_LEVEL), on which the verdict rests.
    pub verdict_band: Option<[f64; 2]>,
    /// Order of each three neighbouring rows, from the finest on; `null` where they change to both sides.
    pub local_orders: Vec<Option<f64>>,
    /// The second term of the error, where the table shows one.
    pub second_term: Option<SecondTerm>,
    /// Constant C of the relative error `C dt^p`.
    pub error_constant: Option<f64>,
    /// What the values do.
    pub class: Class,
    /// Judgement of this column.
    pub verdict: Verdict,
    /// Why, in one clause.
    pub reason: String,
    /// What would decide it, in one sentence; only where it is undecided.
    pub advice: Option<String>,
    /// How the order was found.
    pub rule: &'static str,
    /// Limit for dt -> 0, in the unit of the column.
    pub limit: Option<f64>,
    /// Interval of the limit at [`AUDIT_LEVEL`](super::AUDIT_LEVEL).
    pub limit_band: Option<[f64; 2]>,
    /// Exact value, if known.
    pub exact: Option<f64>,
    /// Relative error of the finest value, as in `converge`; `null` where no exact value is known.
    pub relative_error: Option<f64>,
    /// Whether the scene fixes it, whatever the step.
    pub fixed: bool,
    /// Two numbers between which the exact value is proved to lie (docs/enclosures.md); `null` where none are.
    pub proved: Option<(f64, f64)>,
    /// What that proves of the finest value, in one sentence.
    pub proof: Option<String>,
    /// Whether the values approach it; `null` where it or the limit is not known.
    pub agrees_with_exact: Option<bool>,
    /// Error bars of the value at the finest step, each by its rule.
    pub error_bands: Vec<Uncertainty>,
    /// The three-grid rule on the finest grids at least 1.3 apart.
    pub three_grids: Option<ThreeGrids>,
    /// Least squares of Eça and Hoekstra.
    pub least_squares: Option<EcaHoekstra>,
    /// Every row.
    pub points: Vec<AuditPoint>,
}

/// The judgement of a table: what `penetrode audit --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Audit {
    /// `penetrode/audit/1`.
    pub schema: &'static str,
    /// Worst verdict of the columns.
    pub verdict: Verdict,
    /// Remarks on the table and its columns.
    pub findings: Vec<Finding>,
    /// One per column, in the order of the table.
    pub quantities: Vec<QuantityAudit>,
    /// The schemes that reproduce the table; `null` without a scene, or where no row can be compared.
    pub scheme: Option<Identification>,
}

/// The formal orders to compare with: of every quantity, and of single ones, which win.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FormalOrders {
    /// Of all others.
    pub all: Option<f64>,
    /// Of single columns, by name.
    pub single: Vec<(String, f64)>,
}

impl FormalOrders {
    /// One order for all quantities.
    pub fn of_all(order: Option<f64>) -> Self {
        Self { all: order, single: Vec::new() }
    }

    /// The order expected of a column.
    pub fn of(&self, column: &Column) -> Option<f64> {
        let is_meant = |name: &str| name == column.name() || name == column.with_unit();
        self.single.iter().rev().find(|(single, _)| is_meant(single)).map(|(_, order)| *order).or(self.all)
    }
}

impl FromStr for FormalOrders {
    type Err = String;

    /// `2`, or `depth=2,time=1`, or both: `1,depth=2`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut orders = Self::default();
        for part in text.split(',') {
            let (name, number) =
                part.split_once('=').map_or((None, part), |(name, number)| (Some(name.trim()), number));
            let order: f64 = number.trim().parse().map_err(|_| format!("`{number}` is not a number"))?;
            let Some(name) = name else {
                orders.all = Some(order);
                continue;
            };
            orders.single.push((name.to_owned(), order));
        }
        Ok(orders)
    }
}

impl QuantityAudit {
    /// Takes the law of the relative error. An order whose interval has no end is not shown: it is where the search ends.
    pub(super) fn observe(&mut self, PowerLaw { order, interval95, verdict_band, error_constant }: PowerLaw) {
        self.verdict_band = Some(verdict_band);
        if interval95.iter().all(|end| end.abs() < ORDER_SHOWN) {
            self.observed_order = Some(order);
            self.interval = Some(interval95);
            self.error_constant = Some(error_constant);
        }
    }

    pub(super) fn finding(&self, kind: FindingKind) -> Finding {
        Finding { kind, quantity: Some(self.quantity.clone()), message: self.reason.clone() }
    }
}
