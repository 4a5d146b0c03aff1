//! Do step-size results of another code converge, how fast, and to what?
//!
//! A table of `dt_s` and results comes in ([`Table::read`]), a verdict comes out ([`audit`]): order with interval,
//! class, error bars by named rules, and agreement with the exact values where they are known.
//!
//! A table that cannot be judged is an [`AuditError`] with file, line and column (exit code 2). NaN, divergence,
//! oscillation, a missed order, a wrong limit and a quantity that the scene does not have fail (3); constants that the
//! scene does not fix, zero errors and noise leave it undecided (4). Rows out of order and repeated rows are put right
//! and mentioned.

mod column;
mod run;
mod table;

use std::str::FromStr;

use serde::Serialize;
use thiserror::Error;

use super::enclosure;
use super::grid_convergence::{
    Behaviour, EcaHoekstra, GridValue, ThreeGrids, Uncertainty, eca_hoekstra, local_order, range, roache, three_grids,
    xing_stern,
};
use super::limit::{LawOfValues, SCATTER_SURE, SecondTerm, is_constant, is_monotone, law_of_values, order_ahead};
use super::order::{Class, Exclusion, ORDER_RESOLUTION, PowerLaw, ROUND_OFF_ALLOWANCE, StepError, fit_at_level};
use super::quantity::Quantity;
use super::scheme_of_table::Identification;
use super::verdict::Verdict;
use crate::exchange::tables::TableError;
use crate::physics::{Advice, Shown};
pub use column::{Column, RESULTS};
pub use run::{Axis, Reading, Run, RunError};
pub(crate) use table::FlightRow;
pub use table::{ROWS_MAX, Table};
use table::{ResultColumn, StepRow};

/// Two-sided level of the intervals behind a verdict on one table.
///
/// Coarser than that of a suite, which judges a hundred fits of sixty points at once: four rows leave one degree of
/// freedom, and at 10⁻⁶ nothing could be said of them.
pub const AUDIT_LEVEL: f64 = 1e-3;

/// Grids closer than this ratio are not used in the three-grid rules where others are there (Celik et al. 2008).
const RATIO_MIN: f64 = 1.3;

/// Fewest different steps, of a table with a formal order for every column and of others.
const STEPS_WITH_ORDER: usize = 2;
const STEPS_MIN: usize = 3;

/// An interval of the order that reaches this far has no end there.
const ORDER_SHOWN: f64 = 9.9;

/// Few rows bear an order out within this share of it (Roache; Oberkampf and Roy).
const ORDER_NEAR: f64 = 0.1;

/// Tables of so many rows leave their laws at most two degrees of freedom.
const FEW_ROWS: usize = 5;

/// Without a formal order a slower fall of the errors is no convergence that a table of steps can show.
const ORDER_PASSED: f64 = 0.25;

/// The exact value lies within this many error bars of the finest value, or it is not borne out.
const EXACT_REACH: f64 = 1.25;

/// Scatter over range of few rows that follow a law.
const FEW_SCATTER: f64 = 1e-2;

/// A column that a known scheme reproduces passes when its finest value is this near to the exact one, when a column of
/// the table tells schemes and scenes apart by digits down to the second share, and its own reach down to the third: the
/// time of a step's end may be a short number.
const NEAR_EXACT: f64 = 0.05;
const DIGITS_SURE: f64 = 1e-4;
const DIGITS_LEAST: f64 = 2e-3;

/// How far from the orders of the three finest rows an order may lie.
const ORDER_SPARE: f64 = 0.25;

/// Least order to compare with: below it halving the step moves the error by less than 7 %.
pub const ORDER_MIN: f64 = 0.1;

/// Largest order to compare with: beyond it four steps do not fit between an error of one and round-off.
pub const ORDER_MAX: f64 = 32.0;

/// Why a table cannot be judged (exit code 2).
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AuditError {
    /// A fault of the table itself.
    #[error(transparent)]
    Table(#[from] Box<TableError>),
    /// A run of another code that gives no row: its file, and why.
    #[error("{0}: {1}")]
    Run(String, RunError),
    /// An order to compare with that no study of step sizes can show.
    #[error("the order {} is not allowed: a number from {ORDER_MIN} to {ORDER_MAX}", Shown(*.0))]
    BadOrder(f64),
    /// An order for a column that is not there.
    #[error("an order is given for `{name}`, and the columns are {columns}")]
    NoColumn {
        /// Name given.
        name: String,
        /// Names of the columns.
        columns: String,
    },
}

impl Advice for AuditError {
    fn help(&self) -> String {
        match self {
            Self::Table(error) => error.help(),
            Self::Run(_, error) => error.help(),
            Self::NoColumn { .. } => "name a column of the table, or give one order for all".to_owned(),
            Self::BadOrder(_) => "give the formal order of the other code's scheme, such as 1 or 2".to_owned(),
        }
    }
}

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
    fn scale(&self, quantity: Quantity, value: f64) -> Option<f64> {
        let is_velocity = quantity.is_over_impact_speed() || quantity == Quantity::CriticalVelocity;
        let scale = if is_velocity { self.impact_velocity } else { value };
        (value.is_finite() && scale.is_finite() && scale != 0.0).then_some(scale.abs())
    }

    /// What a code computes whose `quantity` tends to `limit` and not to `exact`.
    fn outcome_of(&self, quantity: Quantity, limit: f64, exact: f64) -> &'static str {
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
    /// Its interval at [`AUDIT_LEVEL`], on which the verdict rests.
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
    /// Interval of the limit at [`AUDIT_LEVEL`].
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

/// Judges a table, by the formal `orders` of the other scheme and the exact solution where it is known.
///
/// Order and limit are fitted to the values ([`super::limit`]); against an exact value the order is fitted to the errors
/// ([`super::order`]), and the limit must agree. Where a known scheme reproduces every row, its orders are expected, and
/// the column passes. Three rows are judged by the published rules for three grids, two with a
/// formal order have an error bar.
///
/// # Errors
/// [`AuditError::BadOrder`] for an expected order outside [`ORDER_MIN`] to [`ORDER_MAX`], [`AuditError::NoColumn`] for one
/// of a column that is not there, [`AuditError::Table`] for two steps without an order.
pub fn audit(
    table: &Table,
    orders: &FormalOrders,
    exact: Option<&ExactValues>,
    scheme: Option<Identification>,
) -> Result<Audit, AuditError> {
    let given = orders.all.iter().chain(orders.single.iter().map(|(_, order)| order));
    if let Some(order) = given.copied().find(|order| !(ORDER_MIN..=ORDER_MAX).contains(order)) {
        return Err(AuditError::BadOrder(order));
    }
    let names: Vec<&str> = table.columns.iter().map(|column| column.column.name()).collect();
    let is_there = |name: &str| names.contains(&name) || table.columns.iter().any(|c| c.column.with_unit() == name);
    if let Some((name, _)) = orders.single.iter().find(|(name, _)| !is_there(name)) {
        return Err(AuditError::NoColumn { name: name.clone(), columns: names.join(", ") });
    }
    table.holds_steps(if given_for_all(table, orders) { STEPS_WITH_ORDER } else { STEPS_MIN })?;
    let mut findings = table.findings.clone();
    let judged = table.columns.iter().map(|column| {
        let mut judge = Judge::new(table, column, orders.of(&column.column), exact);
        judge.scheme = scheme.as_ref();
        judge.decide();
        findings.append(&mut judge.findings);
        judge.judged
    });
    let quantities: Vec<QuantityAudit> = judged.collect();
    // A table always has a column.
    let verdict = quantities.iter().map(|column| column.verdict).max().unwrap_or(Verdict::Undecided);
    Ok(Audit { schema: "penetrode/audit/1", verdict, findings, quantities, scheme })
}

/// Whether every column has a formal order.
fn given_for_all(table: &Table, orders: &FormalOrders) -> bool {
    table.columns.iter().all(|column| orders.of(&column.column).is_some())
}

impl QuantityAudit {
    /// Takes the law of the relative error. An order whose interval has no end is not shown: it is where the search ends.
    fn observe(&mut self, PowerLaw { order, interval95, verdict_band, error_constant }: PowerLaw) {
        self.verdict_band = Some(verdict_band);
        if interval95.iter().all(|end| end.abs() < ORDER_SHOWN) {
            self.observed_order = Some(order);
            self.interval = Some(interval95);
            self.error_constant = Some(error_constant);
        }
    }

    fn finding(&self, kind: FindingKind) -> Finding {
        Finding { kind, quantity: Some(self.quantity.clone()), message: self.reason.clone() }
    }
}

/// The judgement of a column while it is made.
struct Judge<'a> {
    table: &'a Table,
    column: &'a ResultColumn,
    exact: Option<&'a ExactValues>,
    scheme: Option<&'a Identification>,
    grids: Vec<GridValue>,
    judged: QuantityAudit,
    findings: Vec<Finding>,
}

impl<'a> Judge<'a> {
    fn new(
        table: &'a Table,
        column: &'a ResultColumn,
        formal_order: Option<f64>,
        exact: Option<&'a ExactValues>,
    ) -> Self {
        // The values round by the digits printed, and by the arithmetic at least.
        let grid = |row: &StepRow| {
            let value = row.value(column);
            GridValue { step: row.step, value, round_off: column.rounding.max(0.5 * f64::EPSILON * value.abs()) }
        };
        let grids: Vec<GridValue> = table.rows.iter().map(grid).collect();
        let point = |grid: &GridValue| {
            let GridValue { step, value, .. } = *grid;
            AuditPoint { dt_s: step, value, error: None, used: false, excluded: None }
        };
        // Failed until shown otherwise.
        let judged = QuantityAudit {
            quantity: column.column.clone(),
            formal_order,
            rule: "none",
            finest: grids.first().map(|grid| Finest { dt_s: grid.step, value: grid.value }).unwrap_or_default(),
            points: grids.iter().map(point).collect(),
            ..QuantityAudit::default()
        };
        Self { table, column, exact, scheme: None, grids, judged, findings: Vec::new() }
    }

    fn finest(&self) -> GridValue {
        self.grids[0]
    }

    /// Ends the judgement: `reason` is also a remark.
    fn end(&mut self, verdict: Verdict, kind: FindingKind, reason: String) {
        self.judged.verdict = verdict;
        self.judged.reason = reason;
        self.findings.push(self.judged.finding(kind));
    }

    fn decide(&mut self) {
        let column = self.column;
        let is_bad = |row: &&StepRow| !row.step.is_finite() || !row.value(column).is_finite();
        if let Some(row) = self.table.rows.iter().find(is_bad) {
            let (file, value) = (&self.table.file, row.value(column));
            let reason = format!("{file}:{}: {value} at the step {} s is not finite", row.line, row.step);
            return self.end(Verdict::Failed, FindingKind::NotFinite, reason);
        }
        let quantity = column.column.quantity();
        let said = self.exact.zip(quantity).map_or(Exact::Unknown, |(exact, quantity)| exact.values[quantity as usize]);
        if let Exact::Free(value) | Exact::Fixed(value) = said {
            self.judged.exact = Some(value);
            self.judged.proved = self.exact.zip(quantity).and_then(|(exact, quantity)| exact.proved[quantity as usize]);
            let GridValue { value: finest, round_off, .. } = self.finest();
            let said = |proved| enclosure::sentence("the finest value", finest, round_off, proved, quantity?.unit());
            self.judged.proof = self.judged.proved.and_then(said);
            let scale = self.exact.zip(quantity).and_then(|(exact, quantity)| exact.scale(quantity, value));
            self.judged.relative_error = scale.map(|scale| (self.finest().value - value).abs() / scale);
        }
        if let Exact::Fixed(value) = said {
            self.judged.fixed = true;
            if self.grids.iter().all(|grid| (grid.value - value).abs() <= grid.round_off + f64::EPSILON * value.abs()) {
                self.judged.class = Class::AtFloor;
                self.judged.agrees_with_exact = Some(true);
                self.judged.error_band = Some(self.printed_digits());
                self.judged.verdict = Verdict::Passed;
                self.judged.reason = format!("every row gives the {value:.6} that the scene fixes");
                return;
            }
        }
        let of_scheme = self.scheme.zip(quantity).and_then(|(scheme, quantity)| scheme.formal_order(quantity));
        let given = self.judged.formal_order;
        self.judged.formal_order = given.or(of_scheme);
        self.judged.local_orders = self.grids.windows(3).map(local_order).collect();
        let law = law_of_values(&self.grids, None, AUDIT_LEVEL).ok();
        self.add_three_grids();
        self.classify(law.as_ref());
        self.add_bands(law.as_ref());
        self.compare_limit(law.as_ref());
        let is_expected = given.is_none_or(|given| of_scheme == Some(given));
        if let Some(scheme) = self.scheme.filter(|scheme| is_expected && self.is_reproduced(scheme)) {
            let order = of_scheme.map_or_else(String::new, |order| format!(", of order {order} here"));
            self.judged.verdict = Verdict::Passed;
            self.judged.advice = None;
            if self.judged.agrees_with_exact == Some(false) {
                // A limit that scatter has moved is none.
                (self.judged.agrees_with_exact, self.judged.limit, self.judged.limit_band) = (None, None, None);
            }
            self.judged.reason = format!("{}{order}", scheme.sentence());
            self.findings.clear();
        }
        if let Exact::Absent(why) = said {
            self.end(Verdict::Failed, FindingKind::Absent, format!("the scene has no such quantity: {why}"));
        }
    }

    /// Whether the column is what a known scheme gives, in digits that no other scene would have, and near the exact
    /// value: steps beyond the limit of stability are reproduced too. Values at the ends of steps may alternate, or seem
    /// to approach another value, by chance.
    fn is_reproduced(&self, scheme: &Identification) -> bool {
        let is_near = || {
            let (exact, quantity) = self.judged.exact.zip(self.column.column.quantity())?;
            let scale = self.exact?.scale(quantity, exact)?;
            let is_near = (self.finest().value - exact).abs() <= NEAR_EXACT * scale;
            Some(is_near && self.rounding() <= DIGITS_LEAST * scale && scheme.reproduces(quantity, self.grids.len()))
        };
        let row = &self.table.rows[0];
        let is_sure = |column: &ResultColumn| column.rounding <= DIGITS_SURE * row.value(column).abs();
        self.table.columns.iter().any(is_sure) && is_near() == Some(true)
    }

    /// Class, order and verdict, the exact value as far as the errors go.
    fn classify(&mut self, law: Option<&LawOfValues>) {
        let exact = self.judged.exact;
        let scaled = exact.zip(exact.and_then(|exact| self.exact?.scale(self.column.column.quantity()?, exact)));
        if is_constant(&self.grids) {
            let at_exact = exact.is_some_and(|exact| (self.finest().value - exact).abs() <= 2.0 * self.rounding());
            self.judged.class = if at_exact { Class::AtFloor } else { Class::Undecided };
            let kind = if at_exact { FindingKind::ZeroError } else { FindingKind::Constant };
            self.judged.agrees_with_exact = exact.map(|_| at_exact);
            self.judged.limit = Some(self.finest().value);
            self.advise("give --scene, which may fix it, or leave the column out".to_owned());
            let reason = "the values agree within two units of their last digit".to_owned();
            return self.end(Verdict::Undecided, kind, reason);
        }
        let Some(law) = law else { return self.classify_few(scaled) };
        match scaled {
            Some((exact, scale)) => self.against_exact(exact, scale),
            None => self.against_limit(law),
        }
        if self.judged.class == Class::Undecided && law.behaviour.class() == Class::Oscillating {
            // Against an exact value that they alternate on one side of, the values still alternate.
            self.judged.class = Class::Oscillating;
            self.judged.reason.clone_from(&law.reason);
        }
        self.judge_class(law);
    }

    /// Fits the order of the errors against the exact value.
    fn against_exact(&mut self, exact: f64, scale: f64) {
        let error = |grid: &GridValue| {
            let error = grid.value - exact;
            let rounding = grid.round_off + 0.5 * f64::EPSILON * exact.abs();
            // An error within the printed digits is nothing but rounding. Above them the allowance for accumulated
            // round-off does not apply, for digits are cut once.
            let round_off = if error.abs() <= rounding { rounding } else { rounding / ROUND_OFF_ALLOWANCE };
            StepError { step: grid.step, error: error / scale, round_off: Some(round_off / scale) }
        };
        let judged = &mut self.judged;
        judged.rule = "least squares of ln|error| on ln dt";
        let fit = match fit_at_level(&self.grids.iter().map(error).collect::<Vec<_>>(), AUDIT_LEVEL) {
            Ok(fit) => fit,
            Err(error) => {
                judged.reason = error.to_string();
                return;
            }
        };
        for (point, fitted) in judged.points.iter_mut().zip(&fit.points) {
            point.error = Some(fitted.error.abs());
            point.used = fitted.used;
            point.excluded = fitted.excluded;
        }
        judged.class = fit.class;
        judged.reason = fit.reason;
        if let Some(line) = fit.line {
            judged.observe(line);
        }
        // Two powers in turn bend a line too little for a test of few rows, but not the values.
        let used: Vec<GridValue> =
            self.grids.iter().zip(&judged.points).filter(|(_, point)| point.used).map(|(grid, _)| *grid).collect();
        if let (Class::Converging, Ok(law)) = (judged.class, law_of_values(&used, Some(exact), AUDIT_LEVEL))
            && let Some(second) = law.second
        {
            judged.observe(PowerLaw { error_constant: law.law.error_constant.abs() / scale, ..law.law });
            judged.second_term = Some(second);
            judged.rule = law.rule;
            judged.reason = law.reason;
        }
    }

    /// Takes order and limit from the values themselves.
    fn against_limit(&mut self, law: &LawOfValues) {
        let judged = &mut self.judged;
        judged.rule = law.rule;
        judged.class = law.behaviour.class();
        judged.reason.clone_from(&law.reason);
        judged.second_term = law.second;
        let converges = law.behaviour == Behaviour::MonotoneConverging;
        let scale = if law.limit == 0.0 { 1.0 } else { law.limit.abs() };
        for point in &mut judged.points {
            point.used = true;
            point.error = converges.then_some((point.value - law.limit).abs() / scale);
        }
        judged.observe(PowerLaw { error_constant: law.law.error_constant.abs() / scale, ..law.law });
    }

    /// The verdict that follows from the class and, for a converging column, from the order.
    fn judge_class(&mut self, law: &LawOfValues) {
        let reason = self.judged.reason.clone();
        match self.judged.class {
            Class::Diverging => self.end(Verdict::Failed, FindingKind::Diverging, reason),
            Class::Oscillating => self.end(Verdict::Failed, FindingKind::Oscillating, reason),
            Class::AtFloor => self.end(Verdict::Undecided, FindingKind::ZeroError, reason),
            Class::Undecided => {
                self.advise(self.more_rows(law));
                self.end(Verdict::Undecided, FindingKind::Noise, reason);
            }
            Class::Converging => self.judge_order(law),
        }
    }

    /// Fails an order outside the wide band; passes one that the 95 % interval distinguishes from its neighbours one away,
    /// and that the three finest rows bear out.
    ///
    /// Without an expected order the interval must still be narrower than one, or nothing is known of the order.
    fn judge_order(&mut self, law: &LawOfValues) {
        let judged = &self.judged;
        let (Some(order), Some([low, high]), Some([least, most])) =
            (judged.observed_order, judged.interval, judged.verdict_band)
        else {
            self.advise(self.more_rows(law));
            return self.end(Verdict::Undecided, FindingKind::Noise, self.judged.reason.clone());
        };
        let mut found = format!("order {order:.2}, 95 % interval {low:.2} to {high:.2}");
        if let Some(SecondTerm { order, crossover }) = judged.second_term {
            found += &format!(", beside a term in h^{order:.2} that is as large at the step {crossover:.1e} s");
        }
        let is_clear = match judged.formal_order {
            // Of few rows that scatter any order may be missed by chance: the finest rows must miss it too.
            Some(formal)
                if (formal < least || most < formal)
                    && (self.grids.len() > FEW_ROWS
                        || law.scatter < FEW_SCATTER && self.contradiction(law, formal).is_some()) =>
            {
                let missed = format!("{found}, where {formal} is expected");
                return self.end(Verdict::Failed, FindingKind::OrderMissed, missed);
            }
            // Two terms leave little room: the interval itself must hold the order.
            Some(formal) if judged.second_term.is_some() => {
                (low - ORDER_RESOLUTION..=high + ORDER_RESOLUTION).contains(&formal) && (order - formal).abs() < 0.5
            }
            Some(formal) => (order - formal).abs() < 0.5 && formal - 1.0 < low && high < formal + 1.0,
            None => high - low < 1.0 && order > ORDER_PASSED,
        };
        if !is_clear {
            let why = match judged.formal_order {
                Some(formal) if (order - formal).abs() >= 0.5 => {
                    format!("{formal} is not borne out, and the finer rows alone do not exclude it")
                }
                _ => "too few or too noisy rows to tell".to_owned(),
            };
            self.advise(self.more_rows(law));
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}: {why}"));
        }
        // Two terms that the values follow closely explain what few rows show.
        let is_explained = judged.second_term.is_some() && law.scatter < SCATTER_SURE;
        if let Some(formal) = judged.formal_order.filter(|_| !is_explained)
            && let Some(shown) = self.contradiction(law, formal)
        {
            self.advise(self.finer_rows());
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}, but {shown}"));
        }
        if let Some(why) = self.missed_by_little(law) {
            self.advise(self.finer_rows());
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}, but {why}"));
        }
        self.judged.verdict = Verdict::Passed;
        self.judged.reason = found;
    }

    /// The order of the finest rows, where it contradicts the `formal` one.
    ///
    /// Each value may be off by its rounding and twice its deviation. Of [`FEW_ROWS`] and fewer the deviations are no
    /// measure of noise: the finest three, and the order that they tend to, must be within a tenth of the formal one.
    fn contradiction(&self, law: &LawOfValues, formal: f64) -> Option<String> {
        let shown = self.judged.local_orders.first().copied().flatten();
        let words = || match shown {
            Some(shown) => format!("the three finest rows show {shown:.2}: the order drifts"),
            None => "the three finest rows show none".to_owned(),
        };
        if self.grids.len() <= FEW_ROWS {
            let near = |order: f64| (order - formal).abs() <= ORDER_NEAR * formal;
            let ahead = order_ahead(&self.grids);
            return if shown.is_some_and(near) && ahead.is_some_and(near) { None } else { Some(words()) };
        }
        let orders = (0..8).map(|signs: u32| {
            let mut three = [self.grids[0], self.grids[1], self.grids[2]];
            for (i, (grid, deviation)) in three.iter_mut().zip(law.deviations).enumerate() {
                let off = grid.round_off + 2.0 * deviation;
                grid.value += if signs >> i & 1 == 0 { off } else { -off };
            }
            local_order(&three)
        });
        let orders = orders.collect::<Option<Vec<f64>>>()?;
        let least = orders.iter().copied().fold(f64::INFINITY, f64::min);
        let most = orders.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if (least - ORDER_SPARE..=most + ORDER_SPARE).contains(&formal) { None } else { Some(words()) }
    }

    /// Why the exact value does not bear out what the errors against it show.
    ///
    /// A limit that is missed by little only lowers the order of the errors. So the law of the values themselves must
    /// reach the exact value, and have the order of the errors.
    fn missed_by_little(&self, law: &LawOfValues) -> Option<String> {
        let (exact, [low, high]) = (self.judged.exact?, self.judged.interval?);
        if law.behaviour != Behaviour::MonotoneConverging {
            return None;
        }
        let half = EXACT_REACH * law.half_width(&self.finest());
        if (self.finest().value - exact).abs() > half {
            return Some(format!(
                "the values approach {:.6}, and the exact {exact:.6} is farther off than that",
                law.limit
            ));
        }
        let [least, most] = law.law.interval95;
        let apart = low > most + ORDER_NEAR || high < least - ORDER_NEAR;
        apart.then(|| format!("the values themselves show the order {:.2}", law.law.order))
    }

    /// Class and verdict of two or three rows, which leave nothing to check a law by: the published criterion decides,
    /// an observed order within a tenth of the formal one.
    fn classify_few(&mut self, scaled: Option<(f64, f64)>) {
        let Some(three) = self.judged.three_grids else {
            self.judged.rule = "two grids";
            self.advise("a third step shows an order, a fourth an interval of it".to_owned());
            let reason = "two rows show no order: the error bar rests on the formal one".to_owned();
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, reason);
        };
        self.judged.rule = three.rule;
        self.judged.class = three.behaviour.class();
        self.judged.observed_order = three.order.filter(|order| order.abs() < ORDER_SHOWN);
        self.judged.points.iter_mut().for_each(|point| point.used = true);
        self.judged.limit = three.extrapolated;
        let Some(order) = three.order else {
            self.advise("a fourth step, and more digits".to_owned());
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, "three rows show no order".to_owned());
        };
        let found = format!("three rows show the order {order:.2}");
        match self.judged.class {
            Class::Diverging => {
                let reason = "the values run away while the step shrinks".to_owned();
                return self.end(Verdict::Failed, FindingKind::Diverging, reason);
            }
            Class::Oscillating => {
                self.advise("a fourth step tells an oscillation from scatter".to_owned());
                return self.end(Verdict::Undecided, FindingKind::Oscillating, "the three values alternate".to_owned());
            }
            Class::Converging => {}
            Class::AtFloor | Class::Undecided => {
                self.advise("a fourth step, and more digits".to_owned());
                return self.end(Verdict::Undecided, FindingKind::Noise, "two of three values are equal".to_owned());
            }
        }
        // Against an exact value each pair has an order of its own.
        let pair = |exact: f64, i: usize| {
            let [fine, coarse] = [three.values[i] - exact, three.values[i + 1] - exact];
            (coarse / fine).ln() / three.ratios[i].ln()
        };
        let pairs = scaled.map(|(exact, _)| [pair(exact, 0), pair(exact, 1)]);
        let near = |order: f64, formal: f64| (order - formal).abs() <= ORDER_NEAR * formal;
        let sure = self.rounded_orders(three).is_some_and(|[low, high]| high - low < 0.5);
        let passes = sure
            && match (self.judged.formal_order, pairs) {
                (Some(formal), None) => near(order, formal),
                (Some(formal), Some(pairs)) => near(pairs[0], formal) && near(order, formal),
                (None, Some([fine, coarse])) => near(fine, coarse) && near(fine, order),
                (None, None) => false,
            };
        if passes {
            self.judged.verdict = Verdict::Passed;
            self.judged.reason = found;
            return;
        }
        let why = match self.judged.formal_order {
            _ if !sure => "and the printed digits allow others",
            Some(formal) if !near(order, formal) => "which is not within a tenth of the formal one",
            _ if pairs.is_some() => "and the errors against the exact value another one",
            _ => "and leave nothing to check it by",
        };
        let advice = if sure { "a fourth step gives the order an interval" } else { "print more digits" };
        self.advise(advice.to_owned());
        self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}, {why}"));
    }

    /// The orders of three grids that the rounding of their values allows.
    fn rounded_orders(&self, three: ThreeGrids) -> Option<[f64; 2]> {
        let [f1, f2, f3] = three.values;
        let rounding = self.rounding();
        let order = |sign: f64| {
            let moved = [f1 + sign * rounding, f2 - sign * rounding, f3 + sign * rounding];
            let grids: Vec<GridValue> =
                moved.iter().zip(three.steps).map(|(value, step)| GridValue::new(step, *value)).collect();
            local_order(&grids)
        };
        let (a, b) = (order(1.0)?, order(-1.0)?);
        Some([a.min(b), a.max(b)])
    }

    fn rounding(&self) -> f64 {
        self.grids.iter().fold(0.0, |most, grid| grid.round_off.max(most))
    }

    fn advise(&mut self, advice: String) {
        self.judged.advice = Some(advice);
    }

    fn finer_rows(&self) -> String {
        format!("two finer steps, down to {:.1e} s, show where the order tends to", self.finest().step / 4.0)
    }

    /// Which rows would make the order clear.
    fn more_rows(&self, law: &LawOfValues) -> String {
        let (rounding, range) = (self.rounding(), range(&self.grids));
        let digits = (1e3 * rounding / range).log10().ceil();
        if digits >= 1.0 && law.scatter * range <= 4.0 * rounding {
            return format!("the printed digits are too few: print {digits} more");
        }
        if law.scatter < SCATTER_SURE || is_monotone(&self.grids) && self.grids.len() <= FEW_ROWS {
            return self.finer_rows();
        }
        let (fine, coarse) = (self.finest().step, self.grids[self.grids.len() - 1].step);
        let width = law.law.interval95[1] - law.law.interval95[0];
        // An interval shrinks with the square root of the rows.
        let rows = (self.grids.len() as f64 * ((2.0 * width).powi(2) - 1.0)).clamp(4.0, 60.0).ceil();
        format!(
            "the values scatter, as values at the end of a step do: {rows} more steps between {fine:.1e} and \
             {coarse:.1e} s, of uneven ratios, or steps that end at the events"
        )
    }

    /// The published rule for three grids, on grids as far apart as it asks for where the table has them.
    fn add_three_grids(&mut self) {
        let grids = &self.grids;
        let apart = |from: &GridValue| grids.iter().copied().find(|grid| grid.step >= RATIO_MIN * from.step);
        let three = apart(&grids[0]).and_then(|second| Some([grids[0], second, apart(&second)?]));
        let three = three.or_else(|| <[GridValue; 3]>::try_from(grids.get(..3)?).ok());
        self.judged.three_grids = three.and_then(|three| three_grids(three).ok());
    }

    /// Adds the error bars of the finest value by the published rules, and the one for the headline: diverging values have
    /// none.
    fn add_bands(&mut self, law: Option<&LawOfValues>) {
        let finest = self.finest();
        let digits = self.printed_digits();
        let judged = &mut self.judged;
        if judged.class == Class::Diverging {
            return;
        }
        judged.least_squares = eca_hoekstra(&self.grids).ok();
        let three = judged.three_grids;
        let bands = &mut judged.error_bands;
        bands.extend(three.and_then(|three| three.uncertainty));
        let second =
            three.map_or(self.grids.get(1).copied(), |three| Some(GridValue::new(three.steps[1], three.values[1])));
        if let (Some(coarse), true) = (second, judged.class != Class::Oscillating) {
            let (observed, formal) = (three.and_then(|three| three.order), judged.formal_order);
            bands.extend(roache(finest, coarse, observed, formal));
            bands.extend(
                observed.zip(formal).and_then(|(observed, formal)| xing_stern(finest, coarse, observed, formal)),
            );
        }
        // The laws of Eça and Hoekstra end at order two.
        let is_low = judged.formal_order.or(judged.observed_order).is_none_or(|order| order < 2.5);
        bands.extend(judged.least_squares.filter(|_| is_low).and_then(|least| least.uncertainty));
        let widest = bands.iter().max_by(|a, b| a.half_width.total_cmp(&b.half_width));
        let widest = widest.map(|band| ErrorBand { half_width: band.half_width, rule: band.rule });
        judged.error_band = if is_constant(&self.grids) {
            Some(digits)
        } else if judged.class == Class::Oscillating {
            let half_width = 0.5 * range(&self.grids);
            widest
                .filter(|band| band.half_width > half_width)
                .or(Some(ErrorBand { half_width, rule: "half the range" }))
        } else if let Some(law) = law {
            let half_width = law.half_width(&finest);
            // Too few rows leave the interval wide: twice the published bar covers as well.
            let least =
                judged.least_squares.and_then(|least| least.uncertainty).filter(|_| self.grids.len() <= FEW_ROWS);
            let least =
                least.map(|bar| ErrorBand { half_width: 2.0 * bar.half_width, rule: "twice Eça and Hoekstra" });
            let rule = law.envelope.map_or("95 % interval of the limit", |_| "scatter within a multiple of the step");
            let own = Some(ErrorBand { half_width, rule }).filter(|own| own.half_width.is_finite());
            let range = ErrorBand { half_width: range(&self.grids), rule: "the range of the values" };
            least
                .filter(|least| own.is_none_or(|own| least.half_width < own.half_width))
                .or(own)
                .or(widest)
                .or(Some(range))
        } else {
            let unconfirmed = three.filter(|three| judged.formal_order.is_none() && three.uncertainty.is_some());
            let unconfirmed = unconfirmed.map(|three| {
                let order = three.order.map_or(1.0, |order| order.clamp(0.5, 4.0));
                let [f1, f2, _] = three.values;
                let half_width = 3.0 * (f2 - f1).abs() / (order * three.ratios[0].ln()).exp_m1();
                ErrorBand { half_width, rule: "GCI with Fs 3, for nothing confirms the order" }
            });
            unconfirmed.or(widest)
        }
        .map(|band| ErrorBand { half_width: band.half_width.max(finest.round_off), ..band });
    }

    fn printed_digits(&self) -> ErrorBand {
        ErrorBand { half_width: range(&self.grids) + self.rounding(), rule: "the printed digits" }
    }

    /// Fails values whose limit is not the exact one.
    fn compare_limit(&mut self, law: Option<&LawOfValues>) {
        let finest = self.finest();
        let judged = &mut self.judged;
        if let Some(law) = law.filter(|law| law.behaviour == Behaviour::MonotoneConverging) {
            judged.limit = Some(law.limit);
            judged.limit_band = law.limit_band.iter().all(|end| end.is_finite()).then_some(law.limit_band);
        }
        let (Some(exact), Some(values), Some(quantity)) = (judged.exact, self.exact, self.column.column.quantity())
        else {
            return;
        };
        let rounding = finest.round_off + 0.5 * f64::EPSILON * exact.abs();
        let [low, high] = if let Some([low, high]) = judged.limit_band {
            [low - rounding, high + rounding]
        } else {
            // Without a law three times the bar of the finest value takes its place; printed digits are sure.
            let bar = judged.error_band.map_or(f64::INFINITY, |band| band.half_width);
            let half = if is_constant(&self.grids) { bar } else { (3.0 * bar).max(2.0 * range(&self.grids)) };
            [finest.value - half, finest.value + half]
        };
        let agrees = (low..=high).contains(&exact);
        if judged.limit_band.is_some() || !agrees {
            judged.agrees_with_exact = Some(agrees);
        }
        if !agrees {
            let limit = judged.limit.unwrap_or(finest.value);
            judged.advice = None;
            if let Some(law) = law.filter(|law| law.behaviour == Behaviour::MonotoneConverging) {
                self.against_limit(law);
            }
            let share = if exact == 0.0 {
                String::new()
            } else {
                format!(" ({:+.2} %)", 100.0 * (limit - exact) / exact.abs())
            };
            let what = values.outcome_of(quantity, limit, exact);
            let reason = format!("the values approach {limit:.6} and not the exact {exact:.6}{share}: {what}");
            self.end(Verdict::Failed, FindingKind::WrongLimit, reason);
        }
    }
}

#[cfg(test)]
mod tests;
