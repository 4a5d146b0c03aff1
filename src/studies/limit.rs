//! Order and limit of values over the step, each with an interval, and without an exact value.
//!
//! ```text
//! f(h) = f0 + C h^p,   and where one power does not hold   f(h) = f0 + C h^p + D h^q
//! ```
//!
//! The order is that of the limit h -> 0: where the second term is seen, p is the power of the first.

use std::f64::consts::{LN_2, LN_10};

use serde::Serialize;

use super::grid_convergence::{Behaviour, admissible, local_order, range};
use super::order::{FitError, ORDER_RESOLUTION, PowerLaw, STEPS_MIN, alternates, regular_slope, student_t};
use super::power_law::{GridValue, Model, Samples, Weights};

/// Least order behind a 95 % interval of a limit. Below it a limit is not bounded by any finite table.
const ORDER_LEAST: f64 = 0.5;

/// How far beyond what parts of a table show its limit may lie, over the distance between their limits.
const LIMIT_SPARE: f64 = 2.0;

/// Rows of the smallest part of a table.
const PART_ROWS: usize = 5;

/// Share of the estimated error that a 95 % interval allows for terms beyond those of the law.
const LAW_SPARE: f64 = 0.02;

/// The second term of a law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct SecondTerm {
    /// Its power.
    pub order: f64,
    /// Step at which it is as large as the first (s).
    pub crossover: f64,
}

/// The law that values follow.
#[derive(Clone, Debug, PartialEq)]
pub struct LawOfValues {
    /// What the values do.
    pub behaviour: Behaviour,
    /// Why, in one clause with its numbers.
    pub reason: String,
    /// Order p and the constant C, signed, in the unit of the value per `step^p`. The interval of the order ends at ±10
    /// where the table sets no bound.
    pub law: PowerLaw,
    /// The second term, where the table shows one.
    pub second: Option<SecondTerm>,
    /// Its constant D, signed.
    second_constant: f64,
    /// Limit f0; without meaning unless converging.
    pub limit: f64,
    /// 95 % interval of the limit for orders of one half and more, whatever the values do.
    pub limit95: [f64; 2],
    /// Interval of the limit at the level asked for.
    pub limit_band: [f64; 2],
    /// Bound of the error of the finest value where the values scatter, as those of events at the ends of steps do.
    pub envelope: Option<f64>,
    /// Standard deviation of the values about the law, over their range.
    pub scatter: f64,
    /// Standard deviations of the three finest values about the law.
    pub deviations: [f64; 3],
    /// Order that the law itself has over the three finest steps.
    pub finest_order: Option<f64>,
    /// Name of the rule.
    pub rule: &'static str,
}

/// The law of values at the two-sided level `level` (1e-9 to 1), with the limit where it is `known`.
///
/// For each p the best f0 and C follow linearly, so only p is searched for, in -10..10, by the likelihood of normal
/// deviations that are either equal at all steps or proportional to `h^p`, whichever fits better. The interval of p
/// holds all p that the likelihood ratio does not reject; for equal deviations that is `S(p) <= S (1 + t²/(n - 3))`.
/// Deviations of the size of `round_off` are always allowed for.
///
/// A next term of the error is no deviation of this kind. Where `D h^(p+1)` or `D h^(p+2)` fits better, by an F test at
/// 1 %, it is part of the law. Where it does not, both intervals also hold every order found with up to a third of the
/// rows, the coarsest, left out; of five rows or fewer the local order of the finest three, and what it tends to.
///
/// The values count as converging when three things hold together, for noise follows a flexible law surprisingly often:
/// - they have a trend: perfectly monotone, or by Kendall's test at [`TREND_LEVEL`], which no outlier can fool;
/// - the law fits better than a constant, by an F test at 5 % (four rows 1 %, five 2 %);
/// - the 95 % interval of the order lies above zero.
///
/// # Errors
/// [`FitError`]: not finite, not positive, two values at a step, fewer than four steps.
pub fn law_of_values(grids: &[GridValue], known: Option<f64>, level: f64) -> Result<LawOfValues, FitError> {
    let mut table = admissible(grids, STEPS_MIN)?;
    // Of the finest values that differ by their rounding alone one is kept: the others say nothing of the law.
    let equal = table.iter().take_while(|grid| is_rounding(&table[0], grid)).count();
    table.drain(..(equal - 1).min(table.len() - STEPS_MIN));
    let table = table;
    let n = table.len() as f64;
    let samples = Samples::new(&table, known);
    let too_alike = FitError::TooFewSteps { found: 1, needed: STEPS_MIN };
    let model = law_of(&samples).ok_or(too_alike)?;
    let best = model.best;
    let (mut interval95, mut verdict_band) = (model.orders(0.05), model.orders(level));
    let others = if model.next.is_some() { Vec::new() } else { other_orders(&table, known, best.order) };
    for order in others.into_iter().chain([best.order]) {
        for band in [&mut interval95, &mut verdict_band] {
            *band = hull(*band, [order; 2]);
        }
        verdict_band = hull(verdict_band, [order - ORDER_RESOLUTION, order + ORDER_RESOLUTION]);
    }
    // An order that the table without its coarsest quarter shows otherwise is not established.
    if let Some(fine) = table.len().checked_sub(table.len().div_ceil(4)).filter(|fine| *fine >= STEPS_MIN) {
        let samples = Samples::new(&table[..fine], known);
        if let Some(fine) = law_of(&samples) {
            verdict_band = hull(verdict_band, fine.orders(level));
            let [low, high] = fine.orders(0.05);
            if high - low < 1.0 && fine.next.is_some() == model.next.is_some() {
                interval95 = hull(interval95, [fine.best.order; 2]);
            }
        }
    }
    let limit_band = model.limits(verdict_band, level);
    let clamped = [interval95[0].max(ORDER_LEAST.min(interval95[1])), interval95[1]];
    let limit95 = model.limits(clamped, 0.05);
    let rounding: f64 = (0..table.len()).map(|i| samples.rounding(i).powi(2)).sum();
    // Likelihood ratio to the constant, as the tail of F with 2 and n - 3 degrees of freedom.
    let mean = known.unwrap_or(table.iter().map(|grid| grid.value / n).sum::<f64>());
    let squares: f64 = table.iter().map(|grid| ((grid.value - mean) / samples.scale).powi(2)).sum();
    let constant = -0.5 * n * ((squares + rounding) / n).ln();
    let chance = ((constant - model.best.likelihood) * model.dof as f64 / n).exp();
    let trend = trend_chance(&table.iter().map(|grid| grid.value).collect::<Vec<_>>());
    let [low, high] = interval95;
    let p = best.order;
    let scatter = model.scatter();
    let second = model
        .next
        .map(|next| SecondTerm { order: p + next, crossover: (best.constant / best.second).abs().powf(1.0 / next) })
        .filter(|second| second.crossover.is_finite());
    let beside = second.map_or_else(String::new, |second| {
        format!(", and a term in h^{:.2} is as large at the step {:.1e} s", second.order, second.crossover)
    });
    let (behaviour, reason) = if is_constant(&table) {
        (Behaviour::Constant, "the values agree within two units of their last digit".to_owned())
    } else if let Some(oscillating) = oscillation(&table) {
        let falls = oscillating == Behaviour::OscillatingConverging;
        let amplitude = if falls { "with falling amplitude" } else { "and the amplitude does not fall" };
        (oscillating, format!("the values alternate, {amplitude}"))
    } else if trend > TREND_LEVEL && !is_monotone(&table) && !(scatter < SCATTER_SURE) {
        (Behaviour::Undecided, format!("the values have no trend in the step (chance {trend:.2})"))
    } else if chance.is_nan() || chance > law_level(table.len()) {
        (Behaviour::Undecided, format!("f0 + C h^p fits no better than a constant (chance {chance:.2})"))
    } else if low > 0.0 {
        (Behaviour::MonotoneConverging, format!("the values approach {:.6e} as h^{p:.2}{beside}", best.limit))
    } else if high < 0.0 {
        (Behaviour::MonotoneDiverging, format!("the values run away as h^{p:.2}"))
    } else {
        (Behaviour::Undecided, format!("order {p:.2} is not distinguished from zero, [{low:.2}, {high:.2}]"))
    };
    // Where no trend is seen, deviations may be alike at every step, as the interval of the limit has them, or grow with it
    // unseen: the bar lies between those of both.
    let grows = matches!(best.weights, Weights::Power(_));
    let of_law = (limit95[1] - table[0].value).max(table[0].value - limit95[0]);
    let bound_of_scatter = match behaviour {
        Behaviour::Undecided if !grows && of_law.is_finite() => Some((envelope(&table) * of_law).sqrt()),
        Behaviour::Undecided => Some(envelope(&table)),
        _ => (grows && scatter > SCATTER_BOUNDS).then(|| envelope(&table)),
    };
    Ok(LawOfValues {
        behaviour,
        reason,
        law: PowerLaw { order: p, interval95, verdict_band, error_constant: best.constant },
        second,
        second_constant: best.second,
        limit: best.limit,
        limit95,
        limit_band,
        envelope: bound_of_scatter,
        scatter,
        deviations: samples.deviations(&best, model.dof),
        finest_order: local_order(&[0, 1, 2].map(|i| {
            let h = table[i].step;
            let second = model.next.map_or(0.0, |next| best.second * h.powf(p + next));
            GridValue::new(h, best.constant * h.powf(p) + second)
        })),
        rule: "f0 + C h^p by separable least squares, profile interval",
    })
}

impl LawOfValues {
    /// The value that the law has at `step` (s), in the unit of the values.
    pub fn value_at(&self, step: f64) -> f64 {
        let second = self.second.map_or(0.0, |second| self.second_constant * step.powf(second.order));
        self.limit + self.law.error_constant * step.powf(self.law.order) + second
    }

    /// Half-width of the 95 % interval of the limit about the `finest` value.
    pub fn half_width(&self, finest: &GridValue) -> f64 {
        let half = self.envelope.unwrap_or_else(|| {
            let [low, high] = self.limit95;
            (high - finest.value).max(finest.value - low) + LAW_SPARE * (finest.value - self.limit).abs()
        });
        half + finest.round_off
    }
}

/// Bound of the error of the finest value, at 95 %, where the values lie anywhere within `C h^q` of their limit or on one side
/// of it, as those seen at the ends of steps do.
///
/// Values that are uniform there have the likelihood `(2 C)^-n`, those on one side `C^-n`, for steps in units of their
/// geometric mean. With C log-uniform and the limit f0 flat the posterior of f0 is that at `C = max |f - f0|/h^q`. For one q
/// it covers as often as it says (a family of location and scale). q is 0 (noise, alike at every step), 1, 2 or 3, the orders of
/// schemes, or with a tenth of the chance a half more.
pub(super) fn envelope(table: &[GridValue]) -> f64 {
    let table = &table[..table.len().min(ENVELOPE_ROWS)];
    let (n, finest, unit) = (table.len() as f64, table[0].value, range(table));
    let mean = table.iter().map(|grid| grid.step.ln()).sum::<f64>() / n;
    let powers = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0].map(|q: f64| {
        let weights: Vec<f64> = table.iter().map(|grid| (-q * (grid.step.ln() - mean)).exp()).collect();
        (weights, if q.fract() == 0.0 { LN_10 } else { 0.0 })
    });
    // The logarithm of the posterior of the two limits at each distance from the finest value, of every q.
    let distances: Vec<f64> = (0..460).map(|i| 1e-6 * 1.05_f64.powi(i)).collect();
    let chances = distances.iter().map(|distance| {
        [-1.0, 1.0].map(|side| {
            let off = |grid: &GridValue| (grid.value - finest) / unit - side * distance;
            let is_one_sided = table.iter().all(|grid| off(grid) * side <= grid.round_off / unit);
            let one_sided = if is_one_sided { n * LN_2 + ONE_SIDED } else { 0.0 };
            let of_power = |(weights, likely): &(Vec<f64>, f64)| {
                let reach =
                    table.iter().zip(weights).map(|(grid, weight)| off(grid).abs() * weight).fold(0.0, f64::max);
                distance.ln() + one_sided + likely - n * reach.ln()
            };
            powers.iter().map(of_power).collect::<Vec<f64>>()
        })
    });
    let chances: Vec<Vec<f64>> = chances.map(|sides| sides.concat()).collect();
    let most = chances.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    let masses: Vec<f64> =
        chances.iter().map(|chances| chances.iter().map(|chance| (chance - most).exp()).sum()).collect();
    let (all, mut within) = (masses.iter().sum::<f64>(), 0.0);
    let bound = masses.iter().position(|mass| {
        within += mass;
        within >= 0.95 * all
    });
    unit * distances[bound.unwrap_or(distances.len() - 1)]
}

/// Logarithm of the chance, before any value is seen, that all values lie on one side of their limit, over that of both: the larger,
/// the wider the bars of values on both. With 1/20 the bars of both kinds cover 91 to 97 of 100 random tables.
const ONE_SIDED: f64 = -3.0;

/// Rows of an envelope at most: coarser ones say nothing of the finest.
const ENVELOPE_ROWS: usize = 64;

/// Scatter over range from which values whose deviations grow with the step bound the error by it, also where they follow a law.
const SCATTER_BOUNDS: f64 = 0.03;

fn hull(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Level of the F test for a second term.
const SECOND_LEVEL: f64 = 1e-2;

/// The law of one term, or of two where they are better beyond doubt.
fn law_of<'a>(samples: &'a Samples<'a>) -> Option<Model<'a>> {
    let one = Model::new(samples, None)?;
    Some(two_terms(samples, &one).unwrap_or(one))
}

/// The better law of two terms, if it is better than `one` beyond doubt.
fn two_terms<'a>(samples: &'a Samples<'a>, one: &Model<'_>) -> Option<Model<'a>> {
    let two = [1.0, 2.0].into_iter().filter_map(|next| Model::new(samples, Some(next)));
    let two = two.max_by(|a, b| a.best.likelihood.total_cmp(&b.best.likelihood))?;
    // A first term that grows while the step shrinks would follow a single odd value at the finest step.
    let is_better = two.best.likelihood - one.best.likelihood > two.drop_at(SECOND_LEVEL);
    (is_better && two.best.order > 0.0).then_some(two)
}

/// Whether the values agree within two units of their last digit.
pub(super) fn is_constant(table: &[GridValue]) -> bool {
    range(table) < 4.0 * table.iter().fold(0.0, |most, grid| grid.round_off.max(most))
}

/// The order that the local orders of the four finest rows tend to, as they do with the step.
pub(super) fn order_ahead(table: &[GridValue]) -> Option<f64> {
    let (fine, coarse) = (local_order(table.get(..3)?)?, local_order(table.get(1..4)?)?);
    Some(fine - (coarse - fine) / (table[1].step / table[0].step - 1.0))
}

/// The narrowest interval that a table or its finest rows set to the limit, at the level `level`; `None` where the values
/// scatter about their law, or are too few.
///
/// What a law lacks shows in how far its limit moves when the coarsest rows are left out: an interval reaches twice as far.
/// That is an estimate, and no bound: of 1,000 random tables of three powers of the step the limit of 8 lies outside, and
/// of none outside [`LawOfValues::limit_band`].
pub(super) fn closest_limits(grids: &[GridValue], level: f64) -> Option<[f64; 2]> {
    let table = admissible(grids, STEPS_MIN).ok()?;
    let samples = Samples::new(&table, None);
    let whole = law_of(&samples)?;
    if !(whole.scatter() < SCATTER_SURE) {
        return None;
    }
    let band = |model: &Model<'_>, others: &[f64]| {
        let limit = model.best.limit;
        let moved = others.iter().map(|other| LIMIT_SPARE * (other - limit).abs()).fold(0.0, f64::max);
        hull(model.limits(model.orders(level), level), [limit - moved, limit + moved])
    };
    let rows = table.len();
    let parts = rows.saturating_sub(PART_ROWS).min(6);
    if parts == 0 {
        let others = orders_near(&table, whole.best.order).into_iter().filter_map(|order| whole.at(order));
        return Some(band(&whole, &others.map(|fit| fit.limit).collect::<Vec<_>>()));
    }
    let (mut narrowest, mut before): (Option<[f64; 2]>, _) = (None, whole.best.limit);
    for part in 1..=parts {
        let samples = Samples::new(&table[..rows - (rows - PART_ROWS) * part / parts], None);
        let Some(model) = law_of(&samples) else { continue };
        if model.dof > 1 {
            let band = band(&model, &[before]);
            narrowest = narrowest.filter(|old| old[1] - old[0] <= band[1] - band[0]).or(Some(band));
        }
        before = model.best.limit;
    }
    narrowest
}

/// The order that the finest three rows have, and the one that the orders tend to, within one of `order`.
fn orders_near(table: &[GridValue], order: f64) -> Vec<f64> {
    let near = [local_order(&table[..3]), order_ahead(table)].into_iter().flatten();
    near.map(|near| near.clamp(order - 1.0, order + 1.0)).collect()
}

/// Orders that parts of the table show, where one power is fitted to the whole.
fn other_orders(table: &[GridValue], known: Option<f64>, order: f64) -> Vec<f64> {
    let n = table.len();
    let most = (n / 3).min(n.saturating_sub(5));
    let stages = most.min(6);
    let mut orders: Vec<f64> = (1..=stages)
        .filter_map(|stage| {
            let samples = Samples::new(&table[..n - most * stage / stages], known);
            let model = Model::new(&samples, None)?;
            let [low, high] = model.orders(0.05);
            (high - low < 1.0).then_some(model.best.order)
        })
        .collect();
    if stages == 0 && known.is_none() {
        orders.extend(orders_near(table, order));
    }
    orders
}

/// Level of the F test that a law in the step is better than a constant.
///
/// Four values are monotone by chance in 1 of 12 tables, five in 1 of 60: there the law has to hold more closely.
fn law_level(rows: usize) -> f64 {
    match rows {
        0..=4 => 1e-2,
        5 => 2e-2,
        _ => 5e-2,
    }
}

/// Values as near to a law as this, over their range, need no trend besides: two terms of different signs turn around.
pub(super) const SCATTER_SURE: f64 = 1e-3;

/// Level of Kendall's test for a trend in the step.
pub const TREND_LEVEL: f64 = 2e-3;

/// Chance that values in random sequence show a trend as strong as these, either way (Kendall).
///
/// With D pairs out of order among n values, the distribution of D over all sequences is built exactly up to n = 60 and
/// is normal beyond. It holds whatever the values are distributed like. Equal values count as half a pair.
fn trend_chance(values: &[f64]) -> f64 {
    let n = values.len();
    let pairs = n * (n - 1) / 2;
    let mut disorder = 0.0;
    for (i, a) in values.iter().enumerate() {
        for b in &values[i + 1..] {
            disorder += if a > b { 1.0 } else { 0.5 * f64::from(a == b) };
        }
    }
    let disorder = disorder.min(pairs as f64 - disorder);
    if n > 60 {
        let n = n as f64;
        let deviation = (n * (n - 1.0) * (2.0 * n + 5.0) / 72.0).sqrt();
        let z = (0.5 * pairs as f64 - disorder) / deviation;
        // Student's t of so many degrees of freedom is normal to three digits: bisect its level.
        return [1e-9, 1e-6, TREND_LEVEL, 1e-2, 0.1, 0.5]
            .into_iter()
            .find(|&at| z > student_t(at, 2000))
            .unwrap_or(1.0);
    }
    // Chances of each number of pairs out of order: the m-th value adds 0..m-1 of them, all alike.
    let mut chances = vec![1.0];
    for m in 2..=n {
        let mut next = vec![0.0; chances.len() + m - 1];
        for (at, chance) in chances.iter().enumerate() {
            for slot in &mut next[at..at + m] {
                *slot += chance / m as f64;
            }
        }
        chances = next;
    }
    let up_to: f64 = chances.iter().take(disorder.ceil() as usize + 1).sum();
    (2.0 * up_to).min(1.0)
}

/// What values do that go up and down in turn; `None` for others.
///
/// They converge if the changes between neighbours shrink with the step, by the slope of their logarithms. Changes that
/// follow no power of the step are scatter: 4 random values go up and down in turn in 10 of 24 sequences.
pub(super) fn oscillation(table: &[GridValue]) -> Option<Behaviour> {
    let differences = differences(table);
    let down: Vec<bool> = differences.iter().map(|d| *d < 0.0).collect();
    if differences.contains(&0.0) || !alternates(&down) {
        return None;
    }
    let middles: Vec<f64> = table.windows(2).map(|pair| 0.5 * (pair[0].step.ln() + pair[1].step.ln())).collect();
    let changes: Vec<f64> = differences.iter().map(|d| d.abs().ln()).collect();
    let slope = regular_slope(&middles, &changes)?;
    Some(if slope > 0.0 { Behaviour::OscillatingConverging } else { Behaviour::OscillatingDiverging })
}

/// Whether two values differ by no more than four times their rounding.
fn is_rounding(a: &GridValue, b: &GridValue) -> bool {
    (a.value - b.value).abs() <= 4.0 * a.round_off.max(b.round_off)
}

fn differences(table: &[GridValue]) -> Vec<f64> {
    table.windows(2).map(|pair| pair[1].value - pair[0].value).collect()
}

pub(super) fn is_monotone(table: &[GridValue]) -> bool {
    let differences = differences(table);
    differences.iter().all(|d| *d > 0.0) || differences.iter().all(|d| *d < 0.0)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use super::super::order::noise::Noise;
    use super::*;

    fn grids(rows: &[(f64, f64)]) -> Vec<GridValue> {
        rows.iter().map(|&(step, value)| GridValue::new(step, value)).collect()
    }

    #[test]
    fn self_convergence_recovers_order_limit_and_constant_of_exact_laws() {
        for order in [0.5, 1.0, 2.0, 4.0] {
            let rows: Vec<_> =
                (0..7).map(|i| 1e-5 * 0.6_f64.powi(i)).map(|h| (h, 0.17 - (1e3 * h).powf(order))).collect();
            let result = law_of_values(&grids(&rows), None, 1e-3).unwrap();
            assert_eq!(result.behaviour, Behaviour::MonotoneConverging, "{result:?}");
            assert!((result.law.order - order).abs() < 1e-3, "{result:?}");
            assert!((result.limit - 0.17).abs() < 1e-6, "{result:?}");
            assert!(result.limit_band[0] <= 0.17 && 0.17 <= result.limit_band[1], "{result:?}");
            assert!(result.law.error_constant < 0.0);
        }
    }

    #[test]
    fn intervals_cover_the_order_of_noisy_values() {
        let mut noise = Noise(21);
        let (tables, mut within, mut strictly) = (200, 0, 0);
        for _ in 0..tables {
            let rows: Vec<_> = (0..10)
                .map(|i| 0.6_f64.powi(i))
                .map(|h| (h, 3.0 + 0.1 * h * h * (1.0 + 0.05 * noise.normal())))
                .collect();
            let result = law_of_values(&grids(&rows), None, 1e-3).unwrap();
            let holds = |band: [f64; 2]| usize::from(band[0] <= 2.0 && 2.0 <= band[1]);
            within += holds(result.law.interval95);
            strictly += holds(result.law.verdict_band);
        }
        assert!(within >= 180 && strictly >= 199, "{within} and {strictly} of {tables}");
    }

    #[test]
    fn outliers_and_lucky_sequences_do_not_make_a_law() {
        // Log-normal values, whose outliers a law of high order follows; and four values, monotone once in twelve.
        let mut noise = Noise(22);
        for (rows, tables, kind) in [
            (12, 300, (|noise| (2.0 * noise.normal()).exp()) as fn(&mut Noise) -> f64),
            (4, 1500, |noise: &mut Noise| noise.normal()),
        ] {
            let converging = (0..tables)
                .filter(|_| {
                    let table: Vec<_> = (0..rows).map(|i| (2_f64.powi(i), 5.0 + 0.1 * kind(&mut noise))).collect();
                    law_of_values(&grids(&table), None, 1e-3).unwrap().behaviour == Behaviour::MonotoneConverging
                })
                .count();
            assert!(converging * 200 <= tables, "{converging} of {tables} tables of {rows} rows");
        }
    }

    #[test]
    fn the_trend_test_counts_sequences() {
        // Two of 4! and of 5! sequences are monotone, 1 + 3 of 4! have at most one pair out of order.
        assert!((trend_chance(&[1.0, 2.0, 3.0, 4.0]) - 2.0 / 24.0).abs() < 1e-12);
        assert!((trend_chance(&[5.0, 4.0, 3.0, 2.0, 1.0]) - 2.0 / 120.0).abs() < 1e-12);
        assert!((trend_chance(&[2.0, 1.0, 3.0, 4.0]) - 8.0 / 24.0).abs() < 1e-12);
        assert!(trend_chance(&[1.0; 8]) > 0.99);
        let rising: Vec<f64> = (0..100).map(f64::from).collect();
        assert!(trend_chance(&rising) <= 1e-9);
    }

    #[test]
    fn bad_tables_are_errors() {
        assert!(matches!(
            law_of_values(&grids(&[(1.0, 1.0); 8]), None, 1e-3),
            Err(FitError::TooFewSteps { found: 1, .. })
        ));
        let with = |row| grids(&[(1.0, 1.0), (2.0, 2.0), (3.0, 2.5), (4.0, 2.6), row]);
        assert!(matches!(law_of_values(&with((5.0, f64::NAN)), None, 1e-3), Err(FitError::NotFinite { .. })));
        assert!(matches!(law_of_values(&with((f64::NAN, 1.0)), None, 1e-3), Err(FitError::BadStep { .. })));
        assert!(matches!(law_of_values(&with((2.0, 2.1)), None, 1e-3), Err(FitError::TwoValues { .. })));
        assert!(law_of_values(&with((2.0, 2.0)), None, 1e-3).is_ok());
    }
}
