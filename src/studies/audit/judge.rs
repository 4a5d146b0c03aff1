//! The judgement of one column: its class, its order, its limit, and the verdict that follows.

use super::AUDIT_LEVEL;
use super::judgement::{AuditPoint, Exact, ExactValues, Finding, FindingKind, Finest, QuantityAudit};
use super::table::{ResultColumn, StepRow, Table};
use crate::physics::Shown;
use crate::studies::enclosure;
use crate::studies::grid_convergence::{Behaviour, GridValue, local_order, range};
use crate::studies::limit::{
    LawOfValues, SCATTER_SURE, SecondTerm, closest_limits, is_constant, is_monotone, law_of_values, order_ahead,
};
use crate::studies::order::{Class, ORDER_RESOLUTION, PowerLaw, ROUND_OFF_ALLOWANCE, StepError, fit_at_level};
use crate::studies::quantity::Quantity;
use crate::studies::scheme_of_table::Identification;
use crate::studies::verdict::Verdict;

/// Few rows bear an order out within this share of it (Roache; Oberkampf and Roy).
pub(super) const ORDER_NEAR: f64 = 0.1;

/// Tables of so many rows leave their laws at most two degrees of freedom.
pub(super) const FEW_ROWS: usize = 5;

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

/// How far from the orders of the three finest rows an order may lie, and from the formal one before it is missed.
const ORDER_SPARE: f64 = 0.25;

/// The finest value follows the law of the others within this share of the last change, and this many times what they scatter; so
/// many rows tell.
const STRAY_SHARE: f64 = 0.5;
const STRAY_NOISE: f64 = 10.0;
const STRAY_ROWS: usize = 6;

/// The judgement of a column while it is made.
pub(super) struct Judge<'a> {
    table: &'a Table,
    column: &'a ResultColumn,
    exact: Option<&'a ExactValues>,
    scheme: Option<&'a Identification>,
    pub(super) grids: Vec<GridValue>,
    pub(super) judged: QuantityAudit,
    findings: Vec<Finding>,
}

impl<'a> Judge<'a> {
    pub(super) fn new(
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

    pub(super) fn finest(&self) -> GridValue {
        self.grids[0]
    }

    /// Ends the judgement: `reason` is also a remark.
    pub(super) fn end(&mut self, verdict: Verdict, kind: FindingKind, reason: String) {
        self.judged.verdict = verdict;
        self.judged.reason = reason;
        self.findings.push(self.judged.finding(kind));
    }

    /// With the schemes that reproduce the table.
    pub(super) fn of_scheme(mut self, scheme: Option<&'a Identification>) -> Self {
        self.scheme = scheme;
        self
    }

    /// The judgement; what is remarked goes to `findings`.
    pub(super) fn decide(mut self, findings: &mut Vec<Finding>) -> QuantityAudit {
        self.judge();
        findings.append(&mut self.findings);
        self.judged
    }

    fn judge(&mut self) {
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
        let is_expected = |scheme: &Identification| {
            given.is_none_or(|given| quantity.is_some_and(|quantity| scheme.bears_out(quantity, given)))
        };
        if let Some(scheme) = self.scheme.filter(|scheme| is_expected(scheme) && self.is_reproduced(scheme)) {
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
            let what = if exact.is_some() { "print more digits" } else { "give --scene, which may fix it" };
            self.advise(format!("{what}, or leave the column out"));
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
                if (order - formal).abs() < ORDER_SPARE {
                    // Powers beyond those of the law shift an order by so much and its interval by nothing.
                    self.advise(self.finer_rows());
                    let why = format!("{missed}: too near to it to tell from a drift");
                    return self.end(Verdict::Undecided, FindingKind::OrderUnclear, why);
                }
                return self.end(Verdict::Failed, FindingKind::OrderMissed, missed);
            }
            // Two terms leave little room: the interval itself must hold the order.
            Some(formal) if judged.second_term.is_some() => {
                let is_held = (low - ORDER_RESOLUTION..=high + ORDER_RESOLUTION).contains(&formal);
                is_held && (order - formal).abs() < 0.5 && formal - 0.5 < low && high < formal + 0.5
            }
            Some(formal) => {
                let is_near = (low - ORDER_SPARE..=high + ORDER_SPARE).contains(&formal);
                is_near && (order - formal).abs() < 0.5 && formal - 1.0 < low && high < formal + 1.0
            }
            None => high - low < 1.0 && order > ORDER_PASSED,
        };
        if !is_clear {
            let why = match judged.formal_order {
                Some(formal) if !(low - ORDER_SPARE..=high + ORDER_SPARE).contains(&formal) => {
                    format!("{formal} is not borne out, and the finer rows alone do not exclude it")
                }
                _ => "too few or too noisy rows to tell".to_owned(),
            };
            self.advise(self.more_rows(law));
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}: {why}"));
        }
        // Two terms that the values follow closely explain what few rows show.
        let shown = judged.local_orders.first().copied().flatten();
        let agrees = law.finest_order.zip(shown).is_some_and(|(of_law, shown)| (of_law - shown).abs() <= ORDER_SPARE);
        let is_explained = judged.second_term.is_some() && law.scatter < SCATTER_SURE && agrees;
        // Where the finest rows scatter about another order by more than their digits, all rows must exclude the neighbours of this one beyond doubt;
        // that the order is not zero their trend has shown.
        if let Some(formal) = judged.formal_order.filter(|_| !is_explained)
            && law.deviations.iter().zip(&self.grids).any(|(deviation, grid)| *deviation > 2.0 * grid.round_off)
            && shown.is_none_or(|shown| (shown - formal).abs() > 0.5)
            && !((formal - 1.0 < least || formal <= 1.0) && most < formal + 1.0)
        {
            self.advise(self.more_rows(law));
            let why = format!("{found}: its neighbours are not excluded, and the three finest rows do not show it");
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, why);
        }
        if let Some(formal) = self.judged.formal_order.filter(|_| !is_explained)
            && let Some(shown) = self.contradiction(law, formal)
        {
            self.advise(self.finer_rows());
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}, but {shown}"));
        }
        if let Some(why) = self.missed_by_little(law) {
            self.advise(self.finer_rows());
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}, but {why}"));
        }
        if let Some(stray) = self.stray_finest() {
            self.advise("solve the finest step again, or leave its row out".to_owned());
            return self.end(Verdict::Undecided, FindingKind::StrayRow, format!("{found}, but {stray}"));
        }
        let flight = self.exact.map(|exact| exact.values[Quantity::Time as usize]);
        if let Some(Exact::Free(time)) = flight
            && self.finest().step > time
        {
            self.advise("give dt_s in seconds".to_owned());
            let why = format!("{found}, but each step is longer than the flight of {} s", Shown(time));
            return self.end(Verdict::Undecided, FindingKind::LongSteps, why);
        }
        self.judged.verdict = Verdict::Passed;
        self.judged.reason = found;
    }

    /// Why the finest value does not follow the law of the others: it is that of another step, or its solver no longer gets nearer.
    fn stray_finest(&self) -> Option<String> {
        let [finest, others @ ..] = self.grids.as_slice() else { return None };
        if self.grids.len() < STRAY_ROWS {
            return None;
        }
        let law = law_of_values(others, None, AUDIT_LEVEL).ok()?;
        let expected = law.value_at(finest.step);
        let off = (finest.value - expected).abs();
        let change = (law.value_at(others[0].step) - expected).abs();
        let noise = law.deviations[0] + finest.round_off + others[0].round_off;
        let is_stray =
            law.behaviour == Behaviour::MonotoneConverging && off > STRAY_SHARE * change && off > STRAY_NOISE * noise;
        is_stray.then(|| {
            let (expected, at) = (Shown(expected), Shown(finest.step));
            format!("by the other rows the finest value, at the step {at} s, is {expected}: it is {off:.1e} off that")
        })
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
    /// reach the exact value, have the order of the errors, and hold the exact value as closely as its parts agree.
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
        if low > most + ORDER_NEAR || high < least - ORDER_NEAR {
            return Some(format!("the values themselves show the order {:.2}", law.law.order));
        }
        let [low, high] = closest_limits(&self.grids, AUDIT_LEVEL)?;
        let rounding = self.finest().round_off + 0.5 * f64::EPSILON * exact.abs();
        let is_held = (low - rounding..=high + rounding).contains(&exact);
        (!is_held).then(|| {
            let off = (0.5 * (low + high) - exact).abs();
            format!("the values approach {:.9e}, and the exact {exact:.9e} is {off:.1e} beside it", 0.5 * (low + high))
        })
    }

    pub(super) fn rounding(&self) -> f64 {
        self.grids.iter().fold(0.0, |most, grid| grid.round_off.max(most))
    }

    pub(super) fn advise(&mut self, advice: String) {
        self.judged.advice = Some(advice);
    }

    pub(super) fn finer_rows(&self) -> String {
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
            // Without a law three times the bar of the finest value takes its place; printed digits are sure. Three values that
            // do not converge may lie close together by chance.
            let bar = judged.error_band.map_or(f64::INFINITY, |band| band.half_width);
            let ranges = if law.is_none() && judged.class != Class::Converging { 5.0 } else { 2.0 };
            let half = if is_constant(&self.grids) { bar } else { (3.0 * bar).max(ranges * range(&self.grids)) };
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
