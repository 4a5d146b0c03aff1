//! Does the error vanish with the formal order, also where one power of the step does not hold over the whole range?
//!
//! [`super::order`] fits one power. It is enough as a rule; where it misses the formal order p, the range may be at
//! fault and not the scheme:
//!
//! ```text
//! e(h) = A h^(p-1) + B h^p + C h^(p+1),   A = 0 for a scheme of order p
//! ```
//!
//! - Steps that do not resolve the motion count no more ([`Sample::inside`]).
//! - A better order than the formal one is a pass: the constant B is small, and its term lies below the errors seen.
//! - A lower one is a pass where the three terms, fitted together to the errors with their signs, show an A that is zero
//!   within its interval, and a B that is not.
//! - It is a failure where the finest steps too fall with a lower power, and the power does not rise as they shrink.
//!
//! All else is undecided, with the reason.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::order::{Class, Exclusion, FALSE_ALARM_LEVEL, FitError, OrderFit, StepError, fit, line_of, student_t};
use super::verdict::Verdict;

/// Fewest steps inside the asymptotic range from which it is judged more closely.
const INSIDE_MIN: usize = 8;

/// An order this far below the formal one, and no closer, is another order.
const SHORTFALL_MIN: f64 = 0.25;

/// A rise of the order from the finer half of the steps to the band of the finest quarter that is no drift.
const DRIFT_MAX: f64 = 0.02;

/// Share of the error at the finest steps that a term must make to lead there.
const FINEST_SHARE: f64 = 0.5;

/// Two-sided level at which a term of lower order counts as seen.
const LOWER_LEVEL: f64 = 1e-3;

/// The error at one step of a study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Step and error.
    pub point: StepError,
    /// Whether the step resolves the motion: outside, no order is to be expected.
    pub inside: bool,
}

/// Leading and next power of the error, fitted together with a term of lower order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct TwoPowers {
    /// Exponents: the formal order and one more.
    pub orders: [f64; 2],
    /// Constants of the two terms, in the error's unit per `step^order`; the sign is that of the error.
    pub error_constants: [f64; 2],
    /// 95 % intervals of the constants.
    pub intervals: [[f64; 2]; 2],
}

/// What a fit comes to against the formal order.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The fit that was judged, of the steps inside the range if those outside spoil it.
    pub fit: Result<OrderFit, FitError>,
    /// Verdict.
    pub verdict: Verdict,
    /// Why it is no plain pass, or which powers make it one: one clause with its numbers. Empty for a plain pass.
    pub reason: String,
    /// The powers fitted together, where one alone is no pass.
    pub powers: Option<TwoPowers>,
}

/// Judges `samples`, ascending or not, against the order `formal`.
pub fn judge(samples: &[Sample], formal: Option<f64>) -> Judged {
    let all: Vec<StepError> = samples.iter().map(|sample| sample.point).collect();
    let judged = |fit, verdict, reason| Judged { fit, verdict, reason, powers: None };
    let plain = match fit(&all) {
        Ok(plain) => plain,
        Err(error) => return judged(Err(error), Verdict::Undecided, error.to_string()),
    };
    let Some(formal) = formal else {
        let reason = "no order is expected of it".to_owned();
        return judged(Ok(plain), Verdict::Undecided, reason);
    };
    if plain.class == Class::AtFloor {
        let reason = plain.reason.clone();
        return judged(Ok(plain), Verdict::Undecided, reason);
    }
    let inside: Vec<StepError> = samples.iter().filter(|sample| sample.inside).map(|sample| sample.point).collect();
    if inside.len() < INSIDE_MIN.min(all.len()) {
        let reason = format!("{} of {} steps are too long for the motion", all.len() - inside.len(), all.len());
        return judged(Ok(plain), Verdict::Undecided, reason);
    }
    if plain.verdict(formal) == Verdict::Passed && !lower_leads(&plain, formal) {
        return judged(Ok(plain), Verdict::Passed, String::new());
    }
    let narrow = if inside.len() < all.len() { fit(&inside).unwrap_or(plain) } else { plain };
    let (verdict, reason, powers) = closer(&narrow, formal);
    Judged { fit: Ok(narrow), verdict, reason, powers }
}

/// The verdict on `fit`, of steps inside the range, and why.
fn closer(fit: &OrderFit, formal: f64) -> (Verdict, String, Option<TwoPowers>) {
    if fit.verdict(formal) == Verdict::Passed && !lower_leads(fit, formal) {
        let left_out = "the longest steps do not resolve the motion and are left out".to_owned();
        return (Verdict::Passed, left_out, None);
    }
    let Some(line) = fit.line else { return (Verdict::Undecided, fit.reason.clone(), None) };
    if matches!(fit.class, Class::AtFloor | Class::Oscillating) {
        return (Verdict::Undecided, fit.reason.clone(), None);
    }
    let seen = seen(fit);
    let finest = |share: usize| {
        let count = (seen.len() / share).max(INSIDE_MIN).min(seen.len());
        line_of(&seen[..count], FALSE_ALARM_LEVEL)
    };
    let (Some(half), Some(quarter)) = (finest(2), finest(4)) else {
        return (Verdict::Undecided, fit.reason.clone(), None);
    };
    let powers = three_terms(&seen, formal);
    let lower_leads = powers.as_ref().is_some_and(|terms| terms.lower_leads(&seen));
    let named = powers.as_ref().map(|terms| terms.two);
    let [low, high] = line.verdict_band;
    let falls = format!("the error falls as h^{:.2}", line.order);
    let confirms = |[low, high]: [f64; 2]| low > formal - 1.0 && high >= formal;
    let holds_up = half.verdict_band[1] >= formal && half.order > formal - 0.5;
    if (confirms(line.verdict_band) && holds_up || confirms(half.verdict_band)) && !lower_leads {
        let below = powers.as_ref().map(|terms| terms.two.intervals[0]).map_or(String::new(), |[from, to]| {
            format!(", the constant of h^{formal} is within {from:.1e} to {to:.1e}")
        });
        let how = if low > formal { "faster than" } else { "no slower than" };
        let finest = format!("over the finest half of the steps as h^{:.2}", half.order);
        return (Verdict::Passed, format!("{falls}, {finest}: {how} the formal h^{formal}{below}"), named);
    }
    if let Some(terms) = &powers
        && terms.confirm(&seen)
    {
        let [b, c] = terms.two.error_constants;
        let reason = format!("the errors are {b:.2e} h^{formal} {c:+.2e} h^{}, without a lower power", formal + 1.0);
        return (Verdict::Passed, reason, named);
    }
    let drifts = quarter.verdict_band[0] > half.order + DRIFT_MAX;
    if high < formal - SHORTFALL_MIN && half.order < formal - 0.5 && !drifts {
        let reason = format!("{falls}, over the finest half of the steps as h^{:.2}: below h^{formal}", half.order);
        return (Verdict::Failed, reason, named);
    }
    let why = if lower_leads {
        format!("{falls}, and the finest steps show a lower power beside h^{formal}")
    } else if low <= formal && formal <= high {
        format!("{falls}, but the band {low:.2} to {high:.2} of this verdict also holds {}", other_order(low, formal))
    } else {
        format!("{falls}, over the finest half of the steps as h^{:.2}: the order still drifts", half.order)
    };
    (Verdict::Undecided, why, named)
}

/// Steps and errors that are not round-off, ascending: those that a bend left out are inside the range of two powers.
fn seen(fit: &OrderFit) -> Vec<(f64, f64)> {
    let is_round_off = |reason| matches!(reason, Some(Exclusion::ZeroError | Exclusion::RoundOffFloor));
    let seen = fit.points.iter().filter(|point| !is_round_off(point.excluded));
    seen.map(|point| (point.step, point.error)).collect()
}

/// Whether a lower power than `formal` makes most of the error at the finest step, beyond doubt.
fn lower_leads(fit: &OrderFit, formal: f64) -> bool {
    let seen = seen(fit);
    three_terms(&seen, formal).is_some_and(|terms| terms.lower_leads(&seen))
}

/// The order beside `formal` that a band from `low` on holds.
fn other_order(low: f64, formal: f64) -> f64 {
    if low <= formal - 1.0 { formal - 1.0 } else { formal + 1.0 }
}

/// Three terms fitted together.
#[derive(Clone, Copy, Debug)]
struct ThreeTerms {
    two: TwoPowers,
    /// Intervals of the constant of the term below the formal order, at [`LOWER_LEVEL`] and [`FALSE_ALARM_LEVEL`].
    lower: [[f64; 2]; 2],
    /// Interval of the formal constant, at [`FALSE_ALARM_LEVEL`].
    leading: [f64; 2],
}

impl ThreeTerms {
    /// The step in the middle of the five finest of `seen`, ascending, and the median size of their errors.
    fn finest(seen: &[(f64, f64)]) -> (f64, f64) {
        let finest = &seen[..seen.len().min(5)];
        let mut sizes: Vec<f64> = finest.iter().map(|(_, error)| error.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        (finest[finest.len() / 2].0, sizes[sizes.len() / 2])
    }

    /// Whether the formal term is there, and no lower one that could be seen in the errors `seen`.
    fn confirm(&self, seen: &[(f64, f64)]) -> bool {
        let (step, error) = Self::finest(seen);
        let order = self.two.orders[0];
        let [low, high] = self.lower[0];
        low <= 0.0
            && high >= 0.0
            && low.abs().max(high) * step.powf(order - 1.0) <= FINEST_SHARE * error
            && self.leading[0] * self.leading[1] > 0.0
            && self.two.error_constants[0].abs() * step.powf(order) >= FINEST_SHARE * error
    }

    /// Whether the lower term makes most of the error at the finest of `seen`, beyond doubt.
    fn lower_leads(&self, seen: &[(f64, f64)]) -> bool {
        let (step, error) = Self::finest(seen);
        let [low, high] = self.lower[1];
        let least = if low * high > 0.0 { low.abs().min(high.abs()) } else { 0.0 };
        least * step.powf(self.two.orders[0] - 1.0) >= FINEST_SHARE * error
    }
}

/// `e = A h^(p-1) + B h^p + C h^(p+1)` by least squares of the errors relative to their trend; `None` for too few.
fn three_terms(seen: &[(f64, f64)], formal: f64) -> Option<ThreeTerms> {
    let n = seen.len();
    if n < INSIDE_MIN {
        return None;
    }
    let trend = line_of(seen, FALSE_ALARM_LEVEL)?;
    let unit = (seen.iter().map(|(step, _)| step.ln()).sum::<f64>() / n as f64).exp();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let row = |step: f64| {
        let size = (step / unit).powf(trend.order);
        Vector3::from_fn(|k, _| (step / unit).powf(formal - 1.0 + k as f64) / size)
    };
    let height = trend.error_constant * unit.powf(trend.order);
    let relative = |(step, error): (f64, f64)| error / (height * (step / unit).powf(trend.order));
    for &(step, error) in seen {
        normal += row(step) * row(step).transpose();
        right += row(step) * relative((step, error));
    }
    let inverse = normal.cholesky()?.inverse();
    let fitted = inverse * right;
    let sum: f64 = seen.iter().map(|&(step, error)| (relative((step, error)) - row(step).dot(&fitted)).powi(2)).sum();
    let dof = n - 3;
    let scatter = (sum / dof as f64).sqrt();
    let constant = |k: usize| fitted[k] * height / unit.powf(formal - 1.0 + k as f64);
    let interval = |k: usize, level: f64| {
        let half = student_t(level, dof) * scatter * inverse[(k, k)].sqrt();
        [fitted[k] - half, fitted[k] + half].map(|value| value * height / unit.powf(formal - 1.0 + k as f64))
    };
    let terms = ThreeTerms {
        two: TwoPowers {
            orders: [formal, formal + 1.0],
            error_constants: [constant(1), constant(2)],
            intervals: [interval(1, 0.05), interval(2, 0.05)],
        },
        lower: [LOWER_LEVEL, FALSE_ALARM_LEVEL].map(|level| interval(0, level)),
        leading: interval(1, FALSE_ALARM_LEVEL),
    };
    let numbers = [terms.lower[1], terms.leading, terms.two.intervals[1]];
    numbers.as_flattened().iter().all(|number| number.is_finite()).then_some(terms)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
mod tests {
    use super::super::order::noise::Noise;
    use super::*;

    /// The judgement on 60 errors `law` over three decades below 1, all of them inside.
    fn judged(formal: f64, mut law: impl FnMut(f64, &mut Noise) -> f64) -> Judged {
        let mut noise = Noise(20);
        let sample = |step: f64| Sample {
            point: StepError { step, error: law(step, &mut noise), round_off: Some(1e-30) },
            inside: true,
        };
        let steps = Noise(21).steps(60, 1.0, 3.0);
        judge(&steps.into_iter().map(sample).collect::<Vec<_>>(), Some(formal))
    }

    #[test]
    fn a_next_power_of_the_other_sign_passes_with_both_powers_named() {
        for formal in [1.0, 2.0] {
            // The error changes its sign between 0.2 and beyond the coarse end.
            let mut closer = 0;
            for place in [0.2, 0.4, 0.6, 0.8, 1.0, 1.2] {
                let next = |noise: &mut Noise| (0.8 + 0.4 * noise.uniform()) / place;
                let judged = judged(formal, |h, noise| 2e-3 * h.powf(formal) * (1.0 - h * next(noise)));
                assert_eq!(judged.verdict, Verdict::Passed, "{place}: {}", judged.reason);
                let Some(powers) = judged.powers else { continue };
                let [leading, next] = powers.error_constants;
                closer += 1;
                assert!((leading / 2e-3 - 1.0).abs() < 0.05, "{place}: {leading}");
                assert!((next * place / -2e-3 - 1.0).abs() < 0.1, "{place}: {next}");
            }
            assert!(closer > 0, "one power is never enough");
        }
    }

    #[test]
    fn a_better_order_passes_and_the_constant_of_the_formal_one_is_small() {
        let judged = judged(1.0, |h, noise| 1e-2 * h * h * noise.uniform() + 1e-9 * h);
        assert_eq!(judged.verdict, Verdict::Passed, "{}", judged.reason);
        let [low, high] = judged.powers.unwrap().intervals[0];
        assert!(low < 1e-9 && 1e-9 < high && high < 1e-4, "{low} {high}");
        assert!(judged.reason.contains("faster than the formal h^1"), "{}", judged.reason);
    }

    #[test]
    fn a_lower_order_fails_with_every_noise_and_another_limit_too() {
        type Law = fn(f64, &mut Noise) -> f64;
        let laws: [(&str, f64, Law); 6] = [
            ("first order", 2.0, |h, _| 1e-3 * h),
            ("first order, one-sided", 2.0, |h, noise| 1e-3 * h * noise.uniform()),
            ("first order, of both signs", 2.0, |h, noise| 1e-3 * h * (noise.uniform() - 0.5)),
            ("first order below a second", 2.0, |h, _| 1e-3 * h * (1.0 + h)),
            ("another limit", 1.0, |h, _| 1e-6 + 1e-6 * h),
            ("diverging", 1.0, |h, _| 1e-6 / h),
        ];
        for (name, formal, law) in laws {
            let judged = judged(formal, law);
            assert_eq!(judged.verdict, Verdict::Failed, "{name}: {}", judged.reason);
        }
    }

    #[test]
    fn a_lower_power_that_takes_over_within_the_range_never_passes() {
        for crossover in [0.003, 0.01, 0.03, 0.1, 0.3, 1.0] {
            for sign in [-1.0, 1.0] {
                for noisy in [0.0, 0.5] {
                    let law = |h: f64, noise: &mut Noise| h * (h + sign * crossover) * (1.0 + noisy * noise.uniform());
                    let judged = judged(2.0, law);
                    assert_ne!(judged.verdict, Verdict::Passed, "{crossover} {sign} {noisy}: {}", judged.reason);
                }
            }
        }
    }

    #[test]
    fn steps_that_do_not_resolve_the_motion_neither_fail_nor_pass() {
        let samples = |inside: usize| -> Vec<Sample> {
            (0..60)
                .map(|i| {
                    let step = 1.1_f64.powi(i);
                    Sample { point: StepError::new(step, 1e-3 * step), inside: (i as usize) < inside }
                })
                .collect()
        };
        assert_eq!(judge(&samples(60), Some(2.0)).verdict, Verdict::Failed);
        for inside in [0, INSIDE_MIN - 1] {
            let judged = judge(&samples(inside), Some(2.0));
            assert_eq!(judged.verdict, Verdict::Undecided);
            assert!(judged.reason.contains("too long for the motion"), "{}", judged.reason);
        }
        // Nor do they pass.
        let verdict = |inside| judge(&samples(inside), Some(1.0)).verdict;
        assert_eq!((verdict(0), verdict(INSIDE_MIN)), (Verdict::Undecided, Verdict::Passed));
    }
}
