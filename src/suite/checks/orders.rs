//! Orders of convergence, with and without an exact answer.

use super::super::claim::{Evidence, Measurement, NotMeasured, StepPattern};
use super::super::verdict::Verdict;
use super::Subject;
use crate::integrators::{Boundaries, CentralDifference, Detail, Integrator, Steps};
use crate::studies::convergence::{self, Ladder, QuantityStudy, STEPS_OVER_TIME};
use crate::studies::error::{is_fixed, value_of};
use crate::studies::formal_order::{Path, formal_order};
use crate::studies::grid_convergence::{GridValue, richardson, roache, self_convergence as fit_values, three_grids};
use crate::studies::order::{Class, FALSE_ALARM_LEVEL, FitError, OrderFit};
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;

/// Distance of the fitted order of the central difference from the order expected.
pub(super) fn fixed_step(
    subject: &Subject<'_>,
    expected: f64,
    pattern: StepPattern,
    points: usize,
) -> Result<Measurement, NotMeasured> {
    let quantity = free_quantity(subject)?;
    let exact = subject.yardstick()?;
    let [from, to] = STEPS_OVER_TIME.map(|share| share * exact.flight.end.time);
    let seed = subject.context.seed;
    let ladder = Ladder { from, to, points, seed };
    let claim = subject.claim;
    let critical = quantity == Quantity::CriticalVelocity;
    let key = format!("{:?} {} {} {pattern:?} {points} {critical}", claim.scene, claim.velocity, claim.boundaries);
    let study = subject
        .context
        .memo
        .get(key, || {
            convergence::of_fixed_steps(
                subject.scene,
                &subject.problem,
                (claim.velocity, claim.boundaries),
                ladder,
                critical,
                &|size| steps(pattern, size, seed),
            )
            .map_err(NotMeasured::broken)
        })?
        .iter()
        .find(|study| study.quantity == quantity)
        .cloned()
        .ok_or_else(|| NotMeasured::skip("the scene fixes this quantity"))?;
    if study.formal != Some(expected) {
        return Err(NotMeasured::broken(format!(
            "the claim expects order {expected}, the formal order is {:?}: one of them is wrong",
            study.formal
        )));
    }
    judge(study.fit, study.lost, expected, "dt_s")
}

/// Distance of the slope of error against tolerance from 1.
pub(super) fn proportionality(subject: &Subject<'_>, from: f64, to: f64) -> Result<Measurement, NotMeasured> {
    let study = tolerance_study(subject, from, to)?;
    judge(study.fit, study.lost, 1.0, "rtol")
}

/// Distance of the slope of error against 1/evaluations from the order of the method.
pub(super) fn work_order(subject: &Subject<'_>, from: f64, to: f64) -> Result<Measurement, NotMeasured> {
    let order = subject
        .method(None)?
        .integrator()
        .order()
        .ok_or_else(|| NotMeasured::skip("a method of variable order has no order against work"))?;
    let study = tolerance_study(subject, from, to)?;
    let work = study.work.ok_or_else(|| NotMeasured::broken("no work was counted"))?;
    judge(work, study.lost, f64::from(order), "1/evaluations")
}

/// Self-convergence from the values alone: distance of the extrapolated value from the exact one, over the
/// uncertainty that the fit itself states.
pub(super) fn self_convergence(subject: &Subject<'_>) -> Result<Measurement, NotMeasured> {
    let quantity = free_quantity(subject)?;
    let exact = subject.yardstick()?.flight;
    let value = value_of(quantity, &exact).ok_or_else(|| NotMeasured::skip("no such quantity of one flight"))?;
    let [from, to] = STEPS_OVER_TIME.map(|share| share * exact.end.time);
    let ladder = Ladder { from: from * 10.0, to, points: 40, seed: subject.context.seed };
    let mut grids = Vec::new();
    for size in ladder.sizes() {
        let scheme = CentralDifference::uniform(size, subject.claim.velocity, subject.claim.boundaries);
        let flight = scheme.fly(&subject.problem, Detail::Events).map_err(NotMeasured::broken)?;
        grids.extend(value_of(quantity, &flight).map(|value| GridValue::new(size, value)));
    }
    let found = fit_values(&grids, FALSE_ALARM_LEVEL).map_err(NotMeasured::broken)?;
    let [low, high] = found.limit_band;
    let measurement = Measurement::new((found.limit - value).abs() / (0.5 * (high - low)));
    let measurement = if found.behaviour.class() == Class::Converging {
        measurement
    } else {
        measurement.verdict(Verdict::Undecided)
    };
    Ok(measurement.remark(format!("limit {} in [{low}, {high}]; {}; {}", found.limit, found.reason, found.rule)))
}

/// What the rules for few grids say of three runs, beside the true error: in the asymptotic range Roache's index is 1.25
/// times it, Richardson's extrapolation leaves a small part of it, and the observed order is the formal one.
///
/// Steps and landing make the error smooth only for [`Boundaries::Landed`]; with any other rule a triple shows noise.
pub(super) fn grid_convergence(subject: &Subject<'_>) -> Result<Measurement, NotMeasured> {
    let quantity = free_quantity(subject)?;
    let claim = subject.claim;
    if claim.boundaries != Boundaries::Landed {
        return Err(NotMeasured::skip("three runs show an order only where the steps land on k d"));
    }
    let exact = subject.yardstick()?.flight;
    let formal = formal_order(claim.velocity, claim.boundaries, &Path::of(&subject.problem, &exact), quantity)
        .ok_or_else(|| NotMeasured::skip("no formal order"))?;
    let truth = value_of(quantity, &exact).ok_or_else(|| NotMeasured::skip("no such quantity of one flight"))?;
    let mut grids = Vec::new();
    for share in [1.0 / 20_011.3, 1.0 / 12_007.7, 1.0 / 7_001.9] {
        let size = share * exact.end.time;
        let scheme = CentralDifference::uniform(size, claim.velocity, claim.boundaries);
        let flight = scheme.fly(&subject.problem, Detail::Events).map_err(NotMeasured::broken)?;
        grids.extend(value_of(quantity, &flight).map(|value| GridValue::new(size, value)));
    }
    let [fine, middle, coarse] = grids[..] else { return Err(NotMeasured::broken("a run without the quantity")) };
    let error = (fine.value - truth).abs();
    let order = three_grids([fine, middle, coarse])
        .map_err(NotMeasured::broken)?
        .order
        .ok_or_else(|| NotMeasured::broken("two of three runs agree to the last digit"))?;
    let index = roache(fine, middle, Some(order), Some(formal)).ok_or_else(|| NotMeasured::broken("no index"))?;
    let (index, extrapolated) = (index.half_width / error, richardson(fine, middle, formal));
    let off = [(index / 1.25 - 1.0).abs(), (extrapolated - truth).abs() / error, (order / formal - 1.0).abs()];
    let worst = off.into_iter().fold(0.0, |a: f64, b| if b <= a { a } else { b });
    Ok(Measurement::new(worst)
        .remark(format!("order {order:.4}, GCI {index:.4} times the error, extrapolated {:.1e} of it left", off[1])))
}

fn tolerance_study(subject: &Subject<'_>, from: f64, to: f64) -> Result<QuantityStudy, NotMeasured> {
    let quantity = free_quantity(subject)?;
    if !subject.method_name().is_built() {
        return Err(NotMeasured::skip(format!("this build leaves out {}", subject.method_name())));
    }
    let ladder = Ladder { from: to.min(from), to: to.max(from), points: 40, seed: subject.context.seed };
    let key = format!("{:?} {} {from} {to}", subject.claim.scene, subject.method_name());
    subject
        .context
        .memo
        .get(key, || {
            convergence::of_tolerances(&subject.problem, subject.method_name(), ladder).map_err(NotMeasured::broken)
        })?
        .iter()
        .find(|study| study.quantity == quantity)
        .cloned()
        .ok_or_else(|| NotMeasured::skip("the scene fixes this quantity"))
}

/// The claim's quantity, if the scene leaves it free.
fn free_quantity(subject: &Subject<'_>) -> Result<Quantity, NotMeasured> {
    let quantity = subject.quantity()?;
    if quantity == Quantity::CriticalVelocity && !subject.problem.has_exit() {
        return Err(NotMeasured::skip("a target without a far side has no critical velocity"));
    }
    if quantity != Quantity::CriticalVelocity && is_fixed(quantity, &subject.yardstick()?.flight) {
        return Err(NotMeasured::skip("the scene fixes this quantity"));
    }
    Ok(quantity)
}

/// Steps of one run around `size`.
fn steps(pattern: StepPattern, size: f64, seed: u64) -> Steps {
    /// Entries after which a given sequence starts over: long enough to be no pattern of its own.
    const ENTRIES: usize = 997;
    match pattern {
        StepPattern::Uniform => Steps::Uniform(size),
        StepPattern::Alternating => Steps::Given(vec![size * 4.0 / 3.0, size * 2.0 / 3.0]),
        StepPattern::Smooth => Steps::Given(
            (0..ENTRIES)
                .map(|i| size * (1.0 + 0.5 * (std::f64::consts::TAU * i as f64 / ENTRIES as f64).sin()))
                .collect(),
        ),
        StepPattern::Random => {
            let mut random = Random::for_part(seed, "unequal steps");
            Steps::Given((0..ENTRIES).map(|_| size * random.uniform(0.5, 1.5)).collect())
        }
    }
}

/// Largest share of runs whose outcome may differ from the exact one before nothing is claimed.
const LOST_SHARE_MAX: f64 = 0.2;

/// Distance of a fitted order from the one expected; `lost` runs gave no error to fit.
pub(super) fn judge(
    fit: Result<OrderFit, FitError>,
    lost: usize,
    expected: f64,
    abscissa: &'static str,
) -> Result<Measurement, NotMeasured> {
    let total = lost + fit.as_ref().map_or(0, |fit| fit.points.len());
    let fit: OrderFit = match fit {
        Ok(fit) => fit,
        Err(error @ FitError::TooFewSteps { .. }) => {
            return Ok(Measurement::new(f64::NAN).verdict(Verdict::Undecided).remark(error.to_string()));
        }
        Err(error) => return Err(NotMeasured::broken(error)),
    };
    let Some(line) = fit.line else {
        return Ok(Measurement::new(f64::NAN).verdict(Verdict::Undecided).remark(fit.reason.clone()));
    };
    let distance = (line.order - expected).abs();
    let half_width = 0.5 * (line.interval95[1] - line.interval95[0]);
    let mut remark = format!(
        "order {:.3} [{:.3}, {:.3}] from {} of {} runs, constant {:.3e}",
        line.order,
        line.interval95[0],
        line.interval95[1],
        fit.used(),
        total,
        line.error_constant
    );
    let mut measurement = Measurement::new(distance).resolution(half_width);
    if fit.class != Class::Converging {
        remark = format!("{}: {}; {remark}", fit.class.name(), fit.reason);
        let verdict = if fit.class == Class::Diverging { Verdict::Failed } else { Verdict::Undecided };
        measurement = measurement.verdict(verdict);
    } else if lost as f64 > LOST_SHARE_MAX * total as f64 {
        remark = format!("{lost} of {total} runs have another outcome; {remark}");
        measurement = measurement.verdict(Verdict::Undecided);
    }
    Ok(measurement.remark(remark).evidence(Evidence::Fit { abscissa, formal: expected, fit: Box::new(fit) }))
}
