//! How far is a value from its limit for h -> 0, when no exact value is known?
//!
//! ```text
//! f(h) = f0 + C h^p
//! ```
//!
//! Four published rules, each naming itself in its result (`rule`), for none of them is right for every table:
//! - [`three_grids`]: Celik et al. (2008) with the **sign of the order kept**. As published the order is
//!   `|ln|e32/e21| + q|/ln r21`, and the outer absolute value turns a diverging triple into a converging one;
//! - [`roache`]: the grid convergence index with Roache's factors 1.25 and 3, the order clamped as by Oberkampf and Roy;
//! - [`xing_stern`]: the factor of safety that grows with the distance from the formal order;
//! - [`eca_hoekstra`]: least squares over four grids or more, with an error bar that grows with the scatter.
//!
//! The first three use the order of the three finest grids. The order of a whole table, with an interval, is
//! [`super::limit`].
//!
//! # Sources
//! I. B. Celik et al., J. Fluids Eng. 130 (2008) 078001. P. J. Roache, Verification and Validation in Computational
//! Science and Engineering (1998), ch. 5. W. L. Oberkampf, C. J. Roy, Verification and Validation in Scientific
//! Computing (2010), section 8.6.4. T. Xing, F. Stern, J. Fluids Eng. 132 (2010) 061403. L. Eça, M. Hoekstra,
//! J. Comput. Phys. 262 (2014) 104-130.

use serde::Serialize;

use super::limit::oscillation;
use super::order::{Class, FitError, bisect};
use super::power_law::{Fit, ORDER_MAX, Samples, Terms, Weights};

pub use super::power_law::GridValue;

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
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::MonotoneConverging => "monotone",
            Self::MonotoneDiverging => "diverging",
            Self::OscillatingConverging => "oscillating",
            Self::OscillatingDiverging => "oscillating, diverging",
            Self::Constant => "constant",
            Self::Undecided => "undecided",
        }
    }

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
    /// Steps h1, h2, h3, from fine to coarse.
    pub steps: [f64; 3],
    /// Values f1, f2, f3.
    pub values: [f64; 3],
    /// Refinement ratios r21 = h2/h1 and r32 = h3/h2.
    pub ratios: [f64; 2],
    /// Approximate relative error e_a = |e21/f1|.
    pub approximate_error: Option<f64>,
    /// Richardson's extrapolation to h = 0, `(r21^p f1 - f2)/(r21^p - 1)`; only for a converging triple.
    pub extrapolated: Option<f64>,
    /// Error bar of the finest value, GCI times |f1|; only for a converging triple.
    pub uncertainty: Option<Uncertainty>,
    /// The same over |f1|: the grid convergence index.
    pub grid_convergence_index: Option<f64>,
    /// GCI(coarse pair)/(r^p GCI(fine pair)) of Roache; 1 in the asymptotic range. It is near 1 for any three values
    /// whose mean is large beside their differences, so it proves nothing: shown, never judged.
    pub asymptotic_ratio: Option<f64>,
    /// Name of the rule.
    pub rule: &'static str,
}

/// The values in ascending step, equal rows merged.
pub(super) fn admissible(grids: &[GridValue], needed: usize) -> Result<Vec<GridValue>, FitError> {
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
/// does not converge for every pair of ratios. The error bar is `1.25 |e21|/(r21^p - 1)`, as published also for values
/// that oscillate.
///
/// # Errors
/// [`FitError`]: not finite, not positive, equal steps.
pub fn three_grids(grids: [GridValue; 3]) -> Result<ThreeGrids, FitError> {
    let sorted = admissible(&grids, 3)?;
    let [f1, f2, f3] = [0, 1, 2].map(|i| sorted[i].value);
    let (l21, l32) = ((sorted[1].step / sorted[0].step).ln(), (sorted[2].step / sorted[1].step).ln());
    let (e21, e32) = (f2 - f1, f3 - f2);
    let mut result = ThreeGrids {
        steps: [0, 1, 2].map(|i| sorted[i].step),
        values: [f1, f2, f3],
        ratios: [l21.exp(), l32.exp()],
        approximate_error: Some((e21 / f1).abs()).filter(|error| error.is_finite()),
        rule: "Celik et al. 2008, three grids",
        ..ThreeGrids::default()
    };
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
        let half_width = 1.25 * e21.abs() / growth;
        result.extrapolated = Some(f1 - e21 / growth);
        let rule = "Celik et al. 2008, GCI of the finest grid, Fs 1.25";
        result.uncertainty = Some(Uncertainty { half_width, safety_factor: 1.25, order: p, rule });
        result.grid_convergence_index = Some(half_width / f1.abs()).filter(|gci| gci.is_finite());
        let (fine, coarse) = ((e21 / f1).abs() / growth, (e32 / f2).abs() / (p * l32).exp_m1());
        result.asymptotic_ratio = Some(coarse / (fine * (p * l21).exp())).filter(|ratio| ratio.is_finite());
    }
    Ok(result)
}

/// Order of three values that change to one side, ascending in step.
pub(super) fn local_order(three: &[GridValue]) -> Option<f64> {
    let &[fine, middle, coarse] = three else { return None };
    three_grids([fine, middle, coarse]).ok().filter(|found| found.sign > 0)?.order
}

/// Difference of the largest and the smallest value.
pub(super) fn range(table: &[GridValue]) -> f64 {
    let values = table.iter().map(|grid| grid.value);
    values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
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
    let samples = Samples::new(&table, None);
    let (n, weights) = (table.len(), [Weights::Equal, Weights::InverseStep]);
    let scatter = |fit: Fit, parameters: usize| (fit, (fit.sum / (n - parameters) as f64).sqrt() * samples.scale);
    let least = |best: (Fit, f64), next: (Fit, f64)| if next.1 < best.1 { next } else { best };
    let free = weights.into_iter().filter_map(|weights| {
        let fit = Samples::search(|p| samples.fit(Terms::One(p), weights), |a, b| b.sum < a.sum)?;
        Some(scatter(fit, 3))
    });
    // Different steps always have a fit.
    let Some((free, free_scatter)) = free.reduce(least) else {
        return Err(FitError::TooFewSteps { found: 1, needed: 4 });
    };
    let range = range(&table);
    let behaviour = if range == 0.0 {
        Behaviour::Constant
    } else if let Some(oscillating) = oscillation(&table) {
        oscillating
    } else if free.order > 0.0 {
        Behaviour::MonotoneConverging
    } else {
        Behaviour::MonotoneDiverging
    };
    let accepted = (0.5..=2.0).contains(&free.order);
    let mut chosen = (free, free_scatter);
    if !accepted {
        let fixed = [(Terms::One(1.0), 2), (Terms::One(2.0), 2), (Terms::Two(1.0, 2.0), 3)];
        let allowed = if free.order < 0.5 { &fixed[..] } else { &fixed[..2] };
        let all = allowed.iter().flat_map(|&(terms, parameters)| {
            let samples = &samples;
            weights.into_iter().filter_map(move |weights| Some(scatter(samples.fit(terms, weights)?, parameters)))
        });
        chosen = all.reduce(least).unwrap_or(chosen);
    }
    let (fit, s) = chosen;
    let spacing = range / (n - 1) as f64;
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

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
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
        assert!((result.extrapolated.unwrap() - (1.0 - 0.04 / (2_f64.powf(0.81) - 1.0))).abs() < 1e-12);
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
            }
        }
    }

    #[test]
    fn the_published_examples_of_celik_come_out_to_their_digits() {
        // Celik et al. (2008), table 1; the third oscillates.
        for (steps, values, order, extrapolated, index) in [
            ([1.0, 1.5, 2.0], [6.063, 5.972, 5.863], "1.53", "6.1685", "2.2"),
            ([1.0, 2.0, 4.286], [10.7880, 10.7250, 10.6050], "0.75", "10.8801", "1.1"),
            ([1.0, 2.0, 4.286], [6.0042, 5.9624, 6.0909], "1.51", "6.0269", "0.5"),
        ] {
            let three = three([0, 1, 2].map(|i| (steps[i], values[i])));
            assert_eq!(format!("{:.2}", three.order.unwrap()), order);
            assert_eq!(format!("{:.4}", three.extrapolated.unwrap()), extrapolated);
            assert_eq!(format!("{:.1}", 100.0 * three.grid_convergence_index.unwrap()), index);
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
}
