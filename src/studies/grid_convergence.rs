//! How far is a value from its limit for h -> 0, when no exact value is known?
//!
//! ```text
//! f(h) = f0 + C h^p
//! ```
//!
//! Five rules, each naming itself in its result (`rule`), for none of them is right for every table:
//! - [`three_grids`]: Celik et al. (2008) with the **sign kept**. As published the order is `|ln|e32/e21| + q|/ln r21`; the
//!   outer absolute value turns a diverging triple into a converging one, and a dropped `s` an oscillating one;
//! - [`roache`]: the grid convergence index with Roache's factors 1.25 and 3, the order clamped as by Oberkampf and Roy;
//! - [`xing_stern`]: the factor of safety that grows with the distance from the formal order;
//! - [`eca_hoekstra`]: least squares over four grids or more, with an error bar that grows with the scatter;
//! - [`self_convergence`]: the order itself with an interval, by separable least squares.
//!
//! # Sources
//! I. B. Celik et al., J. Fluids Eng. 130 (2008) 078001. P. J. Roache, Verification and Validation in Computational
//! Science and Engineering (1998), ch. 5. W. L. Oberkampf, C. J. Roy, Verification and Validation in Scientific
//! Computing (2010), section 8.6.4. T. Xing, F. Stern, J. Fluids Eng. 132 (2010) 061403. L. Eça, M. Hoekstra,
//! J. Comput. Phys. 262 (2014) 104-130.

use serde::Serialize;

use super::order::{Class, FitError, ORDER_RESOLUTION, PowerLaw, alternates, bisect, student_t};

/// A value at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridValue {
    /// Step h, positive.
    pub step: f64,
    /// Value f(h).
    pub value: f64,
    /// Half-width of the rounding of `value`: of the last digit printed, or of the arithmetic. Not negative.
    pub round_off: f64,
}

impl GridValue {
    /// A value that is only rounded to `f64`.
    pub fn new(step: f64, value: f64) -> Self {
        Self { step, value, round_off: 0.5 * f64::EPSILON * value.abs() }
    }
}

/// What the values do as the step shrinks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Behaviour {
    /// They approach a limit from one side.
    MonotoneConverging,
    /// They run away to one side.
    MonotoneDiverging,
    /// They approach a limit, or what looks like one, from alternating sides.
    OscillatingConverging,
    /// They alternate with growing amplitude.
    OscillatingDiverging,
    /// They do not depend on the step.
    Constant,
    /// None of this can be decided.
    #[default]
    Undecided,
}

impl Behaviour {
    /// The class in reports.
    pub fn class(self) -> Class {
        match self {
            Self::MonotoneConverging => Class::Converging,
            Self::MonotoneDiverging | Self::OscillatingDiverging => Class::Diverging,
            Self::OscillatingConverging => Class::Oscillating,
            Self::Constant | Self::Undecided => Class::Undecided,
        }
    }
}

/// An error bar of the value on the finest grid, and the rule it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Uncertainty {
    /// Half-width, in the unit of the value.
    pub half_width: f64,
    /// Factor of safety in it.
    pub safety_factor: f64,
    /// Order used in it.
    pub order: f64,
    /// Name of the rule.
    pub rule: &'static str,
}

/// The result of [`three_grids`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct ThreeGrids {
    /// What the three values do.
    pub behaviour: Behaviour,
    /// Observed order with its sign: negative where the values diverge. `None` where two of them are equal.
    pub order: Option<f64>,
    /// s = sign(e32/e21): -1 for an oscillating triple, 0 where two values are equal.
    pub sign: i8,
    /// Richardson's extrapolation to h = 0; only for a converging triple.
    pub extrapolated: Option<f64>,
    /// Error bar of the finest value; only for a converging triple.
    pub uncertainty: Option<Uncertainty>,
    /// GCI(coarse pair)/(r^p GCI(fine pair)) of Roache; 1 in the asymptotic range. It is near 1 for any three values
    /// whose mean is large beside their differences, so it proves nothing: shown, never judged.
    pub asymptotic_ratio: Option<f64>,
    /// Name of the rule.
    pub rule: &'static str,
}

/// Orders beyond this size are not searched for.
const ORDER_MAX: f64 = 10.0;

/// The values in ascending step, equal rows merged.
fn admissible(grids: &[GridValue], needed: usize) -> Result<Vec<GridValue>, FitError> {
    for (index, grid) in grids.iter().enumerate() {
        FitError::check(index, grid.step, grid.value, grid.round_off)?;
    }
    let mut sorted = grids.to_vec();
    sorted.sort_by(|a, b| a.step.total_cmp(&b.step));
    for pair in sorted.windows(2) {
        if pair[0].step == pair[1].step && pair[0].value != pair[1].value {
            return Err(FitError::TwoValues { step: pair[0].step, first: pair[0].value, second: pair[1].value });
        }
    }
    sorted.dedup_by(|a, b| a.step == b.step);
    if sorted.len() < needed {
        return Err(FitError::TooFewSteps { found: sorted.len(), needed });
    }
    Ok(sorted)
}

/// Order, limit and error bar from three grids by Celik et al. (2008), the sign of the change kept.
///
/// With `e21 = f2 - f1`, `e32 = f3 - f2` from fine (1) to coarse (3), ratios `r21`, `r32` and `s = sign(e32/e21)`:
///
/// ```text
/// p ln r21 + ln((r32^p - s)/(r21^p - s)) = ln|e32/e21|
/// ```
///
/// The left side grows with p, so the root is bracketed in -10..10 and bisected: the fixed-point iteration of the paper
/// does not converge for every pair of ratios. The error bar is `1.25 |e21|/(r21^p - 1)`, and half the range of the three
/// values when they oscillate.
///
/// # Errors
/// [`FitError`]: not finite, not positive, equal steps.
pub fn three_grids(grids: [GridValue; 3]) -> Result<ThreeGrids, FitError> {
    let sorted = admissible(&grids, 3)?;
    let [f1, f2, f3] = [0, 1, 2].map(|i| sorted[i].value);
    let (l21, l32) = ((sorted[1].step / sorted[0].step).ln(), (sorted[2].step / sorted[1].step).ln());
    let (e21, e32) = (f2 - f1, f3 - f2);
    let mut result = ThreeGrids { rule: "Celik et al. 2008, three grids, sign kept", ..ThreeGrids::default() };
    if e21 == 0.0 || e32 == 0.0 {
        let behaviour = if e21 == e32 { Behaviour::Constant } else { Behaviour::Undecided };
        return Ok(ThreeGrids { behaviour, ..result });
    }
    let oscillating = (e21 > 0.0) != (e32 > 0.0);
    result.sign = if oscillating { -1 } else { 1 };
    // ln((r^p - s)): for s = 1 the quotient of the two is expm1/expm1, which is l32/l21 at p = 0.
    let left = |p: f64| {
        let quotient = if oscillating {
            ((p * l32).exp() + 1.0) / ((p * l21).exp() + 1.0)
        } else if p == 0.0 {
            l32 / l21
        } else {
            (p * l32).exp_m1() / (p * l21).exp_m1()
        };
        p * l21 + quotient.ln()
    };
    let right = e32.abs().ln() - e21.abs().ln();
    if left(-ORDER_MAX) <= right && right <= left(ORDER_MAX) {
        result.order = Some(bisect(-ORDER_MAX, ORDER_MAX, 80, |p| left(p) < right));
    }
    let converging = result.order.map_or(right > 0.0, |p| p > 0.0);
    result.behaviour = match (oscillating, converging) {
        (false, true) => Behaviour::MonotoneConverging,
        (false, false) => Behaviour::MonotoneDiverging,
        (true, true) => Behaviour::OscillatingConverging,
        (true, false) => Behaviour::OscillatingDiverging,
    };
    if let Some(p) = result.order.filter(|_| converging) {
        let growth = (p * l21).exp_m1();
        let bar = |half_width, rule| Uncertainty { half_width, safety_factor: 1.25, order: p, rule };
        if oscillating {
            // f1 = f0 + C h1^p and f2 = f0 - C h2^p.
            result.extrapolated = Some(f1 + e21 / (growth + 2.0));
            let range = f1.max(f2).max(f3) - f1.min(f2).min(f3);
            result.uncertainty =
                Some(Uncertainty { safety_factor: 1.0, ..bar(0.5 * range, "half the range of an oscillating triple") });
        } else {
            result.extrapolated = Some(f1 - e21 / growth);
            result.uncertainty = Some(bar(1.25 * e21.abs() / growth, "Celik et al. 2008, GCI fine, Fs 1.25"));
            let (fine, coarse) = ((e21 / f1).abs() / growth, (e32 / f2).abs() / (p * l32).exp_m1());
            result.asymptotic_ratio = Some(coarse / (fine * (p * l21).exp())).filter(|ratio| ratio.is_finite());
        }
    }
    Ok(result)
}

/// Richardson's extrapolation of two values to h = 0 for a known order: `f1 - (f2 - f1)/(r^p - 1)`.
///
/// # Panics
/// If the two steps are not positive and different, or the order is not positive: a mistake of the caller.
pub fn richardson(fine: GridValue, coarse: GridValue, order: f64) -> f64 {
    fine.value - (coarse.value - fine.value) / growth(fine, coarse, order)
}

/// r^p - 1 between two grids.
fn growth(fine: GridValue, coarse: GridValue, order: f64) -> f64 {
    assert!(0.0 < fine.step && fine.step < coarse.step, "steps {} and {} do not ascend", fine.step, coarse.step);
    assert!(order > 0.0, "order {order} is not positive");
    (order * (coarse.step / fine.step).ln()).exp_m1()
}

/// Roache's grid convergence index of the finer of two values, `Fs |f2 - f1|/(r^p - 1)`, as a half-width.
///
/// - an observed order within 10 % of the formal one: Fs = 1.25 with the formal order;
/// - an observed order farther away: Fs = 3 with the observed order clamped to 0.5..formal (Oberkampf and Roy);
/// - only a formal order (two grids): Fs = 3;
/// - only an observed order: Fs = 1.25 with it, three grids.
///
/// `None` where neither order is known, or the observed one is not positive: no error bar for what diverges.
///
/// # Panics
/// As [`richardson`].
pub fn roache(fine: GridValue, coarse: GridValue, observed: Option<f64>, formal: Option<f64>) -> Option<Uncertainty> {
    if observed.is_some_and(|p| p.is_nan() || p <= 0.0) {
        return None;
    }
    let (safety_factor, order, rule) = match (observed, formal) {
        (Some(p), Some(formal)) if (p - formal).abs() <= 0.1 * formal => {
            (1.25, formal, "Roache GCI, Fs 1.25, observed order within 10 % of the formal one")
        }
        (Some(p), Some(formal)) => {
            (3.0, p.min(formal).max(0.5_f64.min(formal)), "Roache GCI, Fs 3, order clamped (Oberkampf and Roy)")
        }
        (None, Some(formal)) => (3.0, formal, "Roache GCI, Fs 3, formal order, two grids"),
        (Some(p), None) => (1.25, p, "Roache GCI, Fs 1.25, observed order"),
        (None, None) => return None,
    };
    let half_width = safety_factor * (coarse.value - fine.value).abs() / growth(fine, coarse, order);
    Some(Uncertainty { half_width, safety_factor, order, rule })
}

/// Xing and Stern's factor of safety, for `P = observed/formal` and `d = |f2 - f1|/(r^p - 1)` with the observed order:
///
/// ```text
/// U = (2.45 - 0.85 P) d  for P <= 1,   (16.4 P - 14.8) d  for P > 1
/// ```
///
/// `None` unless both orders are positive.
///
/// # Panics
/// As [`richardson`].
pub fn xing_stern(fine: GridValue, coarse: GridValue, observed: f64, formal: f64) -> Option<Uncertainty> {
    if !(observed > 0.0 && formal > 0.0) {
        return None;
    }
    let ratio = observed / formal;
    let safety_factor = if ratio <= 1.0 { 2.45 - 0.85 * ratio } else { 16.4 * ratio - 14.8 };
    let half_width = safety_factor * (coarse.value - fine.value).abs() / growth(fine, coarse, observed);
    Some(Uncertainty { half_width, safety_factor, order: observed, rule: "Xing and Stern 2010, factor of safety" })
}

/// The result of [`eca_hoekstra`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct EcaHoekstra {
    /// What the values do.
    pub behaviour: Behaviour,
    /// Order of the free fit, with its sign.
    pub order: f64,
    /// Limit of the fit that gives the error bar; only where there is one.
    pub extrapolated: Option<f64>,
    /// Standard deviation of that fit.
    pub scatter: f64,
    /// Error bar of the finest value; `None` for diverging values.
    pub uncertainty: Option<Uncertainty>,
    /// Name of the rule.
    pub rule: &'static str,
}

/// Limit and error bar by Eça and Hoekstra (2014), least squares over four grids or more.
///
/// The free fit `f0 + a h^p` is made without weights and with weights 1/h, and the one of smaller scatter taken. For
/// 0.5 <= p <= 2 it stands. For p > 2 the better of `a h` and `a h²` replaces it, for p < 0.5 the best of those and
/// `a h + b h²`. With `D = (f_max - f_min)/(n - 1)`, `e = |f_fit(h1) - f0|`, the scatter s and the residual at h1:
///
/// ```text
/// U = Fs e + s + |f1 - f_fit(h1)|             for s < D,   Fs = 1.25 for 0.5 <= p < 2.1, else 3
/// U = 3 (s/D) (e + s + |f1 - f_fit(h1)|)      otherwise
/// ```
///
/// # Errors
/// [`FitError`]: not finite, not positive, two values at a step, fewer than four steps.
pub fn eca_hoekstra(grids: &[GridValue]) -> Result<EcaHoekstra, FitError> {
    let table = admissible(grids, 4)?;
    let model = Separable::new(&table);
    let weights = [Weights::Equal, Weights::InverseStep];
    let [equal, inverse] = weights.map(|weights| model.least(weights));
    let scatter = |fit: Fit, parameters: usize| (fit.sum / (table.len() - parameters) as f64).sqrt();
    let free = if scatter(equal, 3) <= scatter(inverse, 3) { equal } else { inverse };
    let range = model.range();
    let behaviour = if range == 0.0 {
        Behaviour::Constant
    } else if let Some(oscillating) = model.oscillation() {
        oscillating
    } else if free.order > 0.0 {
        Behaviour::MonotoneConverging
    } else {
        Behaviour::MonotoneDiverging
    };
    let accepted = (0.5..=2.0).contains(&free.order);
    let mut chosen = (free, scatter(free, 3));
    if !accepted {
        let fixed = weights.into_iter().flat_map(|weights| [1.0, 2.0].map(|p| (model.at(p, weights), 2)));
        let both = weights.into_iter().filter_map(|weights| Some((model.first_and_second(weights)?, 3)));
        let all = fixed.chain(both.filter(|_| free.order < 0.5)).map(|(fit, n)| (fit, scatter(fit, n)));
        chosen = all.fold((free, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best });
    }
    let (fit, s) = chosen;
    let spacing = range / (table.len() - 1) as f64;
    let (estimate, residual) = ((fit.at_finest - fit.limit).abs(), (table[0].value - fit.at_finest).abs());
    let good = accepted || (2.0..2.1).contains(&free.order);
    let (safety_factor, half_width) = if s < spacing {
        let factor = if good { 1.25 } else { 3.0 };
        (factor, factor * estimate + s + residual)
    } else if spacing > 0.0 {
        (3.0 * s / spacing, 3.0 * s / spacing * (estimate + s + residual))
    } else {
        (3.0, 3.0 * (estimate + s + residual))
    };
    let bounded = matches!(behaviour, Behaviour::MonotoneConverging | Behaviour::OscillatingConverging);
    Ok(EcaHoekstra {
        behaviour,
        order: free.order,
        extrapolated: bounded.then_some(fit.limit),
        scatter: s,
        uncertainty: bounded.then_some(Uncertainty {
            half_width,
            safety_factor,
            order: fit.order,
            rule: "Eça and Hoekstra 2014, least squares",
        }),
        rule: "Eça and Hoekstra 2014, least squares",
    })
}

/// The result of [`self_convergence`].
#[derive(Clone, Debug, PartialEq)]
pub struct SelfConvergence {
    /// What the values do.
    pub behaviour: Behaviour,
    /// Why, in one clause with its numbers.
    pub reason: String,
    /// Order p and the constant C, signed, in the unit of the value per `step^p`. The interval of the order ends at ±10
    /// where the table sets no bound.
    pub law: PowerLaw,
    /// Limit f0; without meaning unless converging.
    pub limit: f64,
    /// Interval of the limit at the level asked for.
    pub limit_band: [f64; 2],
    /// Name of the rule.
    pub rule: &'static str,
}

/// Order and limit of `f(h) = f0 + C h^p` without an exact value, at the two-sided level `level` (1e-9 to 1).
///
/// For each p the best f0 and C follow linearly, so only p is searched for, in -10..10, by the likelihood of normal
/// deviations that are either equal at all steps or proportional to `h^p`, whichever fits better. The interval of p
/// holds all p that the likelihood ratio does not reject; for equal deviations that is `S(p) <= S (1 + t²/(n - 3))`.
/// Deviations of the size of `round_off` are always allowed for. The next term of the error is no deviation of this
/// kind, so both intervals also hold every order found with up to a third of the rows, the coarsest, left out.
///
/// The values count as converging when three things hold together, for noise follows a flexible law surprisingly often:
/// - they have a trend: perfectly monotone, or by Kendall's test at [`TREND_LEVEL`], which no outlier can fool;
/// - the law fits better than a constant, by an F test at 5 % (four rows 1 %, five 2 %);
/// - the 95 % interval of the order lies above zero.
///
/// # Errors
/// [`FitError`]: not finite, not positive, two values at a step, fewer than four steps.
pub fn self_convergence(grids: &[GridValue], level: f64) -> Result<SelfConvergence, FitError> {
    let table = admissible(grids, 4)?;
    let model = Separable::new(&table);
    let n = table.len() as f64;
    let best = model.most_likely();
    let mut interval95 = model.profile(&best, model.drop_at(0.05));
    let mut verdict_band = model.profile(&best, model.drop_at(level));
    for order in orders_without_coarsest(&table).into_iter().chain([best.order]) {
        for band in [&mut interval95, &mut verdict_band] {
            *band = [band[0].min(order), band[1].max(order)];
        }
        verdict_band = [verdict_band[0].min(order - ORDER_RESOLUTION), verdict_band[1].max(order + ORDER_RESOLUTION)];
    }
    let limit_band = model.limit_band(&best, verdict_band, model.drop_at(level));
    let rounding: f64 = (0..table.len()).map(|i| model.rounding(i).powi(2)).sum();
    // Likelihood ratio to the constant, as the tail of F with 2 and n - 3 degrees of freedom.
    let mean = table.iter().map(|grid| grid.value).sum::<f64>() / n;
    let squares: f64 = table.iter().map(|grid| (grid.value - mean).powi(2)).sum();
    let constant = -0.5 * n * ((squares + rounding) / n).ln();
    let chance = ((constant - best.likelihood) * (n - 3.0) / n).exp();
    let trend = trend_chance(&table.iter().map(|grid| grid.value).collect::<Vec<_>>());
    let [low, high] = interval95;
    let p = best.order;
    let (behaviour, reason) = if model.range() <= 4.0 * table.iter().fold(0.0, |m, grid| grid.round_off.max(m)) {
        (Behaviour::Constant, "the values agree within two units of their last digit".to_owned())
    } else if let Some(oscillating) = model.oscillation() {
        let falls = oscillating == Behaviour::OscillatingConverging;
        let amplitude = if falls { "with falling amplitude" } else { "and the amplitude does not fall" };
        (oscillating, format!("the values alternate, {amplitude}"))
    } else if trend > TREND_LEVEL && !model.monotone() {
        (Behaviour::Undecided, format!("the values have no trend in the step (chance {trend:.2})"))
    } else if chance.is_nan() || chance > law_level(table.len()) {
        (Behaviour::Undecided, format!("f0 + C h^p fits no better than a constant (chance {chance:.2})"))
    } else if low > 0.0 {
        (Behaviour::MonotoneConverging, format!("the values approach {:.6e} as h^{p:.2}", best.limit))
    } else if high < 0.0 {
        (Behaviour::MonotoneDiverging, format!("the values run away as h^{p:.2}"))
    } else {
        (Behaviour::Undecided, format!("order {p:.2} is not distinguished from zero, [{low:.2}, {high:.2}]"))
    };
    Ok(SelfConvergence {
        behaviour,
        reason,
        law: PowerLaw { order: p, interval95, verdict_band, error_constant: best.constant },
        limit: best.limit,
        limit_band,
        rule: "f0 + C h^p by separable least squares, profile interval",
    })
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

/// Level of Kendall's test for a trend in the step.
pub const TREND_LEVEL: f64 = 2e-3;

/// Orders with the coarsest rows left out, in up to six stages down to two thirds and five rows; only those that their
/// rows determine within one half.
fn orders_without_coarsest(table: &[GridValue]) -> Vec<f64> {
    let most = (table.len() / 3).min(table.len().saturating_sub(5));
    let stages = most.min(6);
    (1..=stages)
        .filter_map(|stage| {
            let model = Separable::new(&table[..table.len() - most * stage / stages]);
            let best = model.most_likely();
            let [low, high] = model.profile(&best, model.drop_at(0.05));
            (high - low < 1.0).then_some(best.order)
        })
        .collect()
}

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

/// How the deviations of a fit are weighed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Weights {
    Equal,
    InverseStep,
    /// Deviations proportional to h^p.
    Power(f64),
}

/// One least-squares solution.
#[derive(Clone, Copy, Debug)]
struct Fit {
    order: f64,
    limit: f64,
    /// C, for the step in its own unit.
    constant: f64,
    at_finest: f64,
    /// Weighted sum of squares, weights of mean one.
    sum: f64,
    likelihood: f64,
    weights: Weights,
}

/// The table scaled for fitting: logarithms of the steps about their mean.
struct Separable<'a> {
    table: &'a [GridValue],
    logs: Vec<f64>,
    log_mean: f64,
    rounding_share: f64,
}

impl<'a> Separable<'a> {
    fn new(table: &'a [GridValue]) -> Self {
        let log_mean = table.iter().map(|grid| grid.step.ln()).sum::<f64>() / table.len() as f64;
        // Three rows, which only the least-squares rules may meet, leave no degree of freedom.
        let rounding_share = 2.0 / 3.0_f64.sqrt() / student_t(0.05, table.len().saturating_sub(3).max(1));
        Self { table, logs: table.iter().map(|grid| grid.step.ln() - log_mean).collect(), log_mean, rounding_share }
    }

    fn weights(&self, weights: Weights) -> Vec<f64> {
        match weights {
            Weights::Equal => vec![1.0; self.logs.len()],
            Weights::InverseStep => self.logs.iter().map(|log| (-log).exp()).collect(),
            Weights::Power(p) => self.logs.iter().map(|log| (-2.0 * p * log).exp()).collect(),
        }
    }

    /// The fit for a given order.
    ///
    /// The basis is `(h^p - 1)/p` about the geometric mean step and not `h^p`: it passes through `ln h` at p = 0 where
    /// `h^p` and the constant become one.
    fn at(&self, order: f64, weights: Weights) -> Fit {
        let basis: Vec<f64> =
            self.logs.iter().map(|&log| if order == 0.0 { log } else { (order * log).exp_m1() / order }).collect();
        let w = self.weights(weights);
        let total: f64 = w.iter().sum();
        let mean = |values: &mut dyn Iterator<Item = f64>| values.zip(&w).map(|(v, w)| v * w).sum::<f64>() / total;
        let basis_mean = mean(&mut basis.iter().copied());
        let value_mean = mean(&mut self.table.iter().map(|grid| grid.value));
        let (mut cross, mut square) = (0.0, 0.0);
        for (i, w) in w.iter().enumerate() {
            let b = basis[i] - basis_mean;
            cross += w * b * (self.table[i].value - value_mean);
            square += w * b * b;
        }
        let slope = if square > 0.0 { cross / square } else { 0.0 };
        let fitted = |i: usize| value_mean + slope * (basis[i] - basis_mean);
        let n = w.len() as f64;
        let (mut sum, mut floor) = (0.0, 0.0);
        for (i, w) in w.iter().enumerate() {
            sum += w * (self.table[i].value - fitted(i)).powi(2);
            floor += w * self.rounding(i).powi(2);
        }
        // The logs have mean zero, so the determinant of these weights is one, except that of 1/h which is not compared.
        let likelihood = -0.5 * n * ((sum + floor).max(f64::MIN_POSITIVE) / n).ln();
        let limit = value_mean - slope * (basis_mean + 1.0 / order);
        let constant = slope / order * (-order * self.log_mean).exp();
        Fit { order, limit, constant, at_finest: fitted(0), sum: sum * n / total, likelihood, weights }
    }

    /// `f0 + a h + b h²`; `None` when the three columns cannot be distinguished.
    fn first_and_second(&self, weights: Weights) -> Option<Fit> {
        let w = self.weights(weights);
        let total: f64 = w.iter().sum();
        let n = w.len();
        let h: Vec<f64> = self.logs.iter().map(|log| log.exp()).collect();
        let design = nalgebra::DMatrix::from_fn(n, 3, |i, j| w[i].sqrt() * [1.0, h[i], h[i] * h[i]][j]);
        let values = nalgebra::DVector::from_fn(n, |i, _| w[i].sqrt() * self.table[i].value);
        let factors = design.clone().qr();
        let solution = factors.r().solve_upper_triangular(&(factors.q().transpose() * &values))?;
        let sum = (&design * &solution - values).norm_squared() * n as f64 / total;
        let at_finest = solution[0] + h[0] * (solution[1] + h[0] * solution[2]);
        Some(Fit { order: 1.0, limit: solution[0], constant: solution[1], at_finest, sum, likelihood: 0.0, weights })
    }

    /// The better of the two weightings at one order, by likelihood.
    fn likely(&self, order: f64) -> Fit {
        let (equal, power) = (self.at(order, Weights::Equal), self.at(order, Weights::Power(order)));
        if equal.likelihood >= power.likelihood { equal } else { power }
    }

    /// The best of a scan over the orders, refined between its neighbours.
    fn search(fit: impl Fn(f64) -> Fit, worse: impl Fn(&Fit, &Fit) -> bool) -> Fit {
        let grid = |i: usize| ORDER_MAX * (i as f64 / 100.0 - 1.0) + 1e-9;
        let better = |best: Fit, next: Fit| if worse(&best, &next) { next } else { best };
        let best = (1..=200).map(|i| fit(grid(i))).fold(fit(grid(0)), &better);
        let (mut low, mut high) = (best.order - 0.1, best.order + 0.1);
        let golden = 0.618_033_988_749_894_9;
        for _ in 0..60 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            (low, high) = if worse(&fit(a), &fit(b)) { (a, high) } else { (low, b) };
        }
        better(best, fit(0.5 * (low + high)))
    }

    fn least(&self, weights: Weights) -> Fit {
        Self::search(|p| self.at(p, weights), |a, b| b.sum < a.sum)
    }

    fn most_likely(&self) -> Fit {
        Self::search(|p| self.likely(p), |a, b| b.likelihood > a.likelihood)
    }

    /// The outermost orders whose likelihood is within `drop` of the best one's.
    fn profile(&self, best: &Fit, drop: f64) -> [f64; 2] {
        [-1.0, 1.0].map(|side| {
            let inside = |p: f64| self.likely(p).likelihood >= best.likelihood - drop;
            let steps = ((ORDER_MAX - side * best.order) / 0.1).max(0.0) as usize;
            // From outside in, so that an interval of several pieces is covered whole.
            let place = |i: usize| best.order + side * 0.1 * i as f64;
            let Some(last) = (1..=steps).rev().find(|&i| inside(place(i))) else {
                return bisect(best.order, place(1), 50, inside);
            };
            if last == steps { side * ORDER_MAX } else { bisect(place(last), place(last + 1), 50, inside) }
        })
    }

    /// The limits that belong to the orders of `band`, each with its own error at the same drop of likelihood.
    fn limit_band(&self, best: &Fit, band: [f64; 2], drop: f64) -> [f64; 2] {
        let n = self.table.len() as f64;
        let mut reach = [best.limit, best.limit];
        for i in 0..=40 {
            let p = band[0] + (band[1] - band[0]) * f64::from(i) / 40.0;
            // A band that touches zero has limits without bound.
            if p <= 1e-3 {
                return [f64::NEG_INFINITY, f64::INFINITY];
            }
            let fit = self.likely(p);
            let w = self.weights(fit.weights);
            let total: f64 = w.iter().sum();
            let basis: Vec<f64> = self.logs.iter().map(|log| (p * log).exp()).collect();
            let mean = basis.iter().zip(&w).map(|(b, w)| b * w).sum::<f64>() / total;
            let square: f64 = basis.iter().zip(&w).map(|(b, w)| w * (b - mean) * (b - mean)).sum();
            let variance = (-2.0 * fit.likelihood / n).exp() * (1.0 / total + mean * mean / square);
            let spare = (drop - (best.likelihood - fit.likelihood)).max(0.0);
            let half = (variance * n * (2.0 * spare / n).exp_m1()).sqrt();
            reach = [reach[0].min(fit.limit - half), reach[1].max(fit.limit + half)];
        }
        reach
    }

    /// Standard deviation of the rounding of row `i`, 1/sqrt(3) of its half-width, as it enters the likelihood.
    ///
    /// The rounding error is known, so Student's t, which is large for few rows, must not inflate it. Scaled by 2/t, it
    /// contributes two standard deviations to the 95 % interval.
    fn rounding(&self, i: usize) -> f64 {
        self.table[i].round_off * self.rounding_share
    }

    /// How far the likelihood may fall below the best inside the interval of a level: `n/2 ln(1 + t²/(n - 3))`.
    fn drop_at(&self, level: f64) -> f64 {
        let n = self.table.len();
        let t = student_t(level, n - 3);
        0.5 * n as f64 * (t * t / (n - 3) as f64).ln_1p()
    }

    fn monotone(&self) -> bool {
        let differences = self.differences();
        differences.iter().all(|d| *d > 0.0) || differences.iter().all(|d| *d < 0.0)
    }

    fn range(&self) -> f64 {
        let values = self.table.iter().map(|grid| grid.value);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    }

    fn differences(&self) -> Vec<f64> {
        self.table.windows(2).map(|pair| pair[1].value - pair[0].value).collect()
    }

    /// What values do that go up and down in turn; `None` for others.
    ///
    /// They converge if the changes between neighbours shrink with the step, by the slope of their logarithms.
    fn oscillation(&self) -> Option<Behaviour> {
        let differences = self.differences();
        let down: Vec<bool> = differences.iter().map(|d| *d < 0.0).collect();
        if differences.contains(&0.0) || !alternates(&down) {
            return None;
        }
        let middle = |i: usize| 0.5 * (self.logs[i] + self.logs[i + 1]);
        let mean = (0..differences.len()).map(middle).sum::<f64>() / differences.len() as f64;
        let slope: f64 = differences.iter().enumerate().map(|(i, d)| (middle(i) - mean) * d.abs().ln()).sum();
        Some(if slope > 0.0 { Behaviour::OscillatingConverging } else { Behaviour::OscillatingDiverging })
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use super::super::order::noise::Noise;
    use super::*;

    fn grids(rows: &[(f64, f64)]) -> Vec<GridValue> {
        rows.iter().map(|&(step, value)| GridValue::new(step, value)).collect()
    }

    fn three(rows: [(f64, f64); 3]) -> ThreeGrids {
        three_grids(rows.map(|(step, value)| GridValue::new(step, value))).unwrap()
    }

    #[test]
    fn a_reversed_triple_diverges_where_other_tools_report_order_two() {
        let good = three([(1.0, 1.01), (2.0, 1.04), (4.0, 1.16)]);
        assert_eq!(good.behaviour, Behaviour::MonotoneConverging);
        assert!((good.order.unwrap() - 2.0).abs() < 1e-12);
        assert!((good.extrapolated.unwrap() - 1.0).abs() < 1e-12);
        assert!((good.uncertainty.unwrap().half_width - 0.0125).abs() < 1e-12);
        let bad = three([(1.0, 1.16), (2.0, 1.04), (4.0, 1.01)]);
        assert_eq!((bad.behaviour, bad.behaviour.class()), (Behaviour::MonotoneDiverging, Class::Diverging));
        assert!((bad.order.unwrap() + 2.0).abs() < 1e-12, "the order keeps its sign: {:?}", bad.order);
        assert_eq!((bad.uncertainty, bad.extrapolated), (None, None));
    }

    #[test]
    fn an_oscillating_triple_is_named_where_other_tools_report_order_0_81() {
        let change = 2_f64.powf(0.81);
        let result = three([(1.0, 1.0), (2.0, 1.04), (4.0, 1.04 - 0.04 * change)]);
        assert_eq!((result.behaviour.class(), result.sign), (Class::Oscillating, -1));
        assert!((result.order.unwrap() - 0.81).abs() < 1e-12);
        assert_eq!(result.uncertainty.unwrap().rule, "half the range of an oscillating triple");
        let growing = three([(1.0, 1.0), (2.0, 1.04), (4.0, 1.02)]);
        assert_eq!((growing.behaviour, growing.behaviour.class()), (Behaviour::OscillatingDiverging, Class::Diverging));
    }

    #[test]
    fn unequal_ratios_of_either_sign_recover_the_order() {
        for order in [0.5, 1.0, 2.0, 3.7] {
            for steps in [[1.0, 1.3, 3.1], [1.0, 2.9, 3.2], [0.2, 0.3, 0.9]] {
                let [h1, h2, h3] = steps.map(|h: f64| h.powf(order));
                let same = three([(steps[0], 5.0 + h1), (steps[1], 5.0 + h2), (steps[2], 5.0 + h3)]);
                assert!((same.order.unwrap() - order).abs() < 1e-9, "{steps:?}, {order}: {same:?}");
                assert!((same.extrapolated.unwrap() - 5.0).abs() < 1e-9);
                let turn = three([(steps[0], 5.0 + h1), (steps[1], 5.0 - h2), (steps[2], 5.0 + h3)]);
                assert!((turn.order.unwrap() - order).abs() < 1e-9, "{steps:?}, {order}: {turn:?}");
                assert!((turn.extrapolated.unwrap() - 5.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_constant_triple_has_no_order_and_no_bar() {
        let result = three([(1.0, 2.0), (2.0, 2.0), (4.0, 2.0)]);
        assert_eq!((result.behaviour, result.order, result.uncertainty), (Behaviour::Constant, None, None));
        assert_eq!(three([(1.0, 2.0), (2.0, 2.0), (4.0, 2.1)]).behaviour, Behaviour::Undecided);
    }

    #[test]
    fn safety_factors_follow_their_rules() {
        let (fine, coarse) = (GridValue::new(1.0, 1.01), GridValue::new(2.0, 1.04));
        let bar = |observed, formal| roache(fine, coarse, observed, formal).map(|bar| (bar.safety_factor, bar.order));
        assert_eq!(bar(Some(1.9), Some(2.0)), Some((1.25, 2.0)));
        assert_eq!(bar(Some(1.5), Some(2.0)), Some((3.0, 1.5)));
        assert_eq!(bar(Some(3.0), Some(2.0)), Some((3.0, 2.0)));
        assert_eq!(bar(Some(0.1), Some(2.0)), Some((3.0, 0.5)));
        assert_eq!(bar(None, Some(2.0)), Some((3.0, 2.0)));
        assert_eq!(bar(Some(1.7), None), Some((1.25, 1.7)));
        for none in [bar(None, None), bar(Some(-2.0), Some(2.0)), bar(Some(f64::NAN), Some(2.0))] {
            assert_eq!(none, None);
        }
        assert!((richardson(fine, coarse, 2.0) - 1.0).abs() < 1e-15);
        // Xing and Stern (2010): 1.6 at P = 1 from both sides, 2.45 at P = 0.
        let factor = |observed| xing_stern(fine, coarse, observed, 2.0).unwrap().safety_factor;
        assert!((factor(2.0) - 1.6).abs() < 1e-12 && (factor(2.0 + 1e-9) - 1.6).abs() < 1e-7);
        assert!((factor(1e-9) - 2.45).abs() < 1e-8 && (factor(4.0) - 18.0).abs() < 1e-12);
        assert_eq!(xing_stern(fine, coarse, -1.0, 2.0), None);
    }

    #[test]
    fn least_squares_gives_limit_and_bar_and_refuses_one_to_diverging_values() {
        let table = |f: &dyn Fn(f64) -> f64| grids(&[1.0, 1.7, 2.9, 5.3, 9.1].map(|h| (h, f(h))));
        let second = eca_hoekstra(&table(&|h| 3.0 + 0.1 * h * h)).unwrap();
        assert!((second.order - 2.0).abs() < 1e-6 && (second.extrapolated.unwrap() - 3.0).abs() < 1e-6, "{second:?}");
        let bar = second.uncertainty.unwrap();
        assert!((bar.half_width - 0.125).abs() < 1e-5 && bar.safety_factor == 1.25, "{bar:?}");
        // A third order is treated as a second one, with the larger factor.
        let third = eca_hoekstra(&table(&|h| 3.0 + 0.1 * h * h * h)).unwrap();
        assert_eq!((third.behaviour, third.uncertainty.unwrap().safety_factor), (Behaviour::MonotoneConverging, 3.0));
        let diverging = eca_hoekstra(&table(&|h| 3.0 + 0.1 / h)).unwrap();
        assert_eq!((diverging.behaviour, diverging.uncertainty), (Behaviour::MonotoneDiverging, None));
        assert_eq!(eca_hoekstra(&table(&|_| 3.0)).unwrap().behaviour, Behaviour::Constant);
    }

    #[test]
    fn self_convergence_recovers_order_limit_and_constant_of_exact_laws() {
        for order in [0.5, 1.0, 2.0, 4.0] {
            let rows: Vec<_> =
                (0..7).map(|i| 1e-5 * 0.6_f64.powi(i)).map(|h| (h, 0.17 - (1e3 * h).powf(order))).collect();
            let result = self_convergence(&grids(&rows), 1e-3).unwrap();
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
            let result = self_convergence(&grids(&rows), 1e-3).unwrap();
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
                    self_convergence(&grids(&table), 1e-3).unwrap().behaviour == Behaviour::MonotoneConverging
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
            self_convergence(&grids(&[(1.0, 1.0); 8]), 1e-3),
            Err(FitError::TooFewSteps { found: 1, .. })
        ));
        let with = |row| grids(&[(1.0, 1.0), (2.0, 2.0), (3.0, 2.5), (4.0, 2.6), row]);
        assert!(matches!(eca_hoekstra(&with((5.0, f64::NAN))), Err(FitError::NotFinite { .. })));
        assert!(matches!(self_convergence(&with((f64::NAN, 1.0)), 1e-3), Err(FitError::BadStep { .. })));
        assert!(matches!(self_convergence(&with((2.0, 2.1)), 1e-3), Err(FitError::TwoValues { .. })));
        assert!(self_convergence(&with((2.0, 2.0)), 1e-3).is_ok());
    }
}
