//! Orders of convergence, with and without an exact answer.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::super::verdict::Verdict;
use super::{FIXED, NO_FAR_SIDE, Subject, off, worst_of};
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, Integrator, Steps};
use crate::studies::convergence::{self, Convergence, FixedSteps, Ladder, QuantityStudy, STEPS_OVER_TIME};
use crate::studies::error::{is_fixed, value_of};
use crate::studies::formal_order::{Path, formal_order};
use crate::studies::grid_convergence::{GridValue, richardson, roache, three_grids};
use crate::studies::limit::law_of_values;
use crate::studies::order::{Class, FALSE_ALARM_LEVEL, FitError, OrderFit, PowerLaw};
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;
use crate::text::or_dash;

check! {
    /// Central difference: distance of the fitted order from `order`.
    Order {
        /// Order expected.
        order: f64,
        /// Pattern of the steps.
        #[serde(default)]
        steps: StepPattern,
        /// How many step sizes; 60 where it is left out.
        points: Option<usize>,
    } in Orders, "order", by fixed_step, compares (Steps | Truth);
    /// Error against tolerance: distance of the slope from 1.
    Proportionality {
        /// Largest tolerance.
        from: f64,
        /// Smallest tolerance.
        to: f64,
    } in Orders, "order", by proportionality, compares (Method | Truth);
    /// Error against work: distance of the slope of error over 1/evaluations from the order of the method.
    WorkOrder {
        /// Largest tolerance.
        from: f64,
        /// Smallest tolerance.
        to: f64,
    } in Orders, "order", by work_order, compares (Method | Truth);
    /// Self-convergence without the exact answer: distance of the extrapolated value from the exact one over the
    /// uncertainty that the fit itself states.
    SelfConvergence {} in Solution, "uncertainty", by self_convergence, compares (Steps | Truth);
    /// Roache's GCI and Richardson's extrapolation on three runs of the central difference against the true error:
    /// worst of |GCI/(1.25 |error|) - 1|, |extrapolated error/error|, and the distance of Celik's order from the formal
    /// one over it.
    GridConvergence {} in Solution, "relative", by grid_convergence, compares (Steps | Truth);
}

/// How the steps of one run are laid out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
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

fn fixed_step(&Order { order: expected, steps: pattern, points }: &Order, subject: &Subject<'_>) -> Found {
    let (seed, points) = (subject.context.seed, points.unwrap_or(60));
    let (velocity, boundaries) = (subject.velocity(), subject.boundaries());
    let critical = subject.quantity()? == Quantity::CriticalVelocity;
    let key = format!("{} {velocity} {boundaries} {pattern:?} {points} {critical}", subject.scene_name()?);
    let study = shared_study(subject, key, |exact| {
        let [from, to] = STEPS_OVER_TIME.map(|share| share * exact.end.time);
        // The shortest steps take most of the time, and narrow no interval much.
        let from = 3.0 * from;
        let scheme = |size| CentralDifference {
            steps: steps(pattern, size, seed),
            ..CentralDifference::uniform(size, velocity, boundaries)
        };
        let range = Some([from, to]);
        let study = FixedSteps { scheme: &scheme, range, points, seed, with_critical: critical, progress: &|_, _| {} };
        Ok(convergence::of_fixed_steps(subject.scene()?, subject.problem()?, exact, &study)?)
    })?;
    let formal = or_dash(study.formal, |order| order.to_string());
    let agree = study.formal == Some(expected);
    holds!(agree, "the claim expects order {expected}, the formal order is {formal}: one of them is wrong");
    judge(study.fit, study.lost, expected)
}

fn proportionality(&Proportionality { from, to }: &Proportionality, subject: &Subject<'_>) -> Found {
    let study = tolerance_study(subject, from, to)?;
    judge(study.fit, study.lost, 1.0)
}

fn work_order(&WorkOrder { from, to }: &WorkOrder, subject: &Subject<'_>) -> Found {
    let order = subject
        .method(None)?
        .integrator()
        .order()
        .ok_or_else(|| NotMeasured::skip("a method of variable order has no order against work"))?;
    let study = tolerance_study(subject, from, to)?;
    let work = study.work.ok_or_else(|| NotMeasured::broken("no work was counted"))?;
    judge(work, study.lost, f64::from(order))
}

/// Values of `quantity` by the claim's scheme at the steps `sizes`.
fn values_at(subject: &Subject<'_>, quantity: Quantity, sizes: &[f64]) -> Found<Vec<GridValue>> {
    let mut grids = Vec::new();
    for &size in sizes {
        let scheme = CentralDifference::uniform(size, subject.velocity(), subject.boundaries());
        let flight = scheme.solve(subject.problem()?, Detail::Events)?;
        grids.extend(value_of(quantity, &flight).map(|value| GridValue::new(size, value)));
    }
    Ok(grids)
}

fn self_convergence(subject: &Subject<'_>) -> Found {
    let quantity = free_quantity(subject)?;
    let exact = subject.truth()?.flight;
    let value = value_of(quantity, &exact).ok_or_else(|| NotMeasured::skip(NOT_OF_A_FLIGHT))?;
    let [from, to] = STEPS_OVER_TIME.map(|share| share * exact.end.time);
    let ladder = Ladder { from: from * 10.0, to, points: 40, seed: subject.context.seed };
    let grids = values_at(subject, quantity, &ladder.sizes())?;
    let found = law_of_values(&grids, None, FALSE_ALARM_LEVEL)?;
    let [low, high] = found.limit_band;
    let is_open = found.behaviour.class() != Class::Converging;
    Ok(Measurement {
        verdict: is_open.then_some(Verdict::Undecided),
        ..Measurement::new((found.limit - value).abs() / (0.5 * (high - low)))
            .remark(format!("limit {} in [{low}, {high}]; {}; {}", found.limit, found.reason, found.rule))
    })
}

/// Steps and landing make the error smooth only for [`Boundaries::Landed`]; with any other rule a triple shows noise.
fn grid_convergence(subject: &Subject<'_>) -> Found {
    let quantity = free_quantity(subject)?;
    let boundaries = subject.boundaries();
    let lands = boundaries == Boundaries::Landed;
    applies!(lands, "three runs show an order only where the steps land on k d");
    let exact = subject.truth()?.flight;
    let formal = formal_order(subject.velocity(), boundaries, &Path::of(subject.problem()?, &exact), quantity)
        .ok_or_else(|| NotMeasured::skip("no formal order"))?;
    let truth = value_of(quantity, &exact).ok_or_else(|| NotMeasured::skip(NOT_OF_A_FLIGHT))?;
    let sizes = [1.0 / 20_011.3, 1.0 / 12_007.7, 1.0 / 7_001.9].map(|share| share * exact.end.time);
    let grids = values_at(subject, quantity, &sizes)?;
    let [fine, middle, coarse] = grids[..] else { return Err(NotMeasured::broken("a run without the quantity")) };
    let error = (fine.value - truth).abs();
    let order = three_grids([fine, middle, coarse])?
        .order
        .ok_or_else(|| NotMeasured::broken("two of three runs agree to the last digit"))?;
    let index = roache(fine, middle, Some(order), Some(formal)).ok_or_else(|| NotMeasured::broken("no index"))?;
    let (index, extrapolated) = (index.half_width / error, richardson(fine, middle, formal));
    let left = (extrapolated - truth).abs() / error;
    Ok(Measurement::new(worst_of([off(index, 1.25), left, off(order, formal)]))
        .remark(format!("order {order:.4}, GCI {index:.4} times the error, extrapolated {left:.1e} of it left")))
}

const NOT_OF_A_FLIGHT: &str = "no such quantity of one solution";

fn tolerance_study(subject: &Subject<'_>, from: f64, to: f64) -> Found<QuantityStudy> {
    let ladder = Ladder { from: to.min(from), to: to.max(from), points: 40, seed: subject.context.seed };
    let key = format!("{} {} {from} {to}", subject.scene_name()?, subject.method_name());
    shared_study(subject, key, |exact| {
        Ok(convergence::of_tolerances(subject.problem()?, exact, subject.method_name(), ladder)?)
    })
}

/// The study of the claim's quantity among those that `compute` makes with the exact solution, once for each `key`.
fn shared_study(
    subject: &Subject<'_>,
    key: String,
    compute: impl FnOnce(&Flight) -> Found<Convergence>,
) -> Found<QuantityStudy> {
    let quantity = free_quantity(subject)?;
    let studies =
        subject.context.memo.studies.get(key, || Ok(Arc::new(compute(&subject.truth()?.flight)?.quantities)))?;
    let study = studies.iter().find(|study| study.quantity == quantity);
    study.cloned().ok_or_else(|| NotMeasured::skip(FIXED))
}

/// The claim's quantity, if the scene leaves it free.
fn free_quantity(subject: &Subject<'_>) -> Found<Quantity> {
    let quantity = subject.quantity()?;
    if quantity == Quantity::CriticalVelocity {
        applies!(subject.problem()?.has_exit(), "{NO_FAR_SIDE}");
    } else {
        applies!(!is_fixed(quantity, &subject.truth()?.flight), "{FIXED}");
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
pub(super) fn judge(fit: Result<OrderFit, FitError>, lost: usize, expected: f64) -> Found {
    let total = lost + fit.as_ref().map_or(0, |fit| fit.points.len());
    let fit = fit.map_err(|error| match error {
        FitError::TooFewSteps { .. } => NotMeasured::undecided(error.to_string()),
        error => NotMeasured::broken(error),
    })?;
    let line = fit.line.ok_or_else(|| NotMeasured::undecided(&fit.reason))?;
    let [low, high] = line.interval95;
    let seen = format!(
        "order {:.3} [{low:.3}, {high:.3}] from {} of {total} runs, constant {:.3e}",
        line.order,
        fit.used(),
        line.error_constant
    );
    let (verdict, remark) = if fit.class != Class::Converging {
        let verdict = if fit.class == Class::Diverging { Verdict::Failed } else { Verdict::Undecided };
        (Some(verdict), format!("{}: {}; {seen}", fit.class.name(), fit.reason))
    } else if lost as f64 > LOST_SHARE_MAX * total as f64 {
        (Some(Verdict::Undecided), format!("{lost} of {total} runs have another outcome; {seen}"))
    } else {
        (None, seen)
    };
    let evidence = Some(Evidence::Fit { formal: expected, fit: Box::new(fit) });
    let measured = Measurement::new((line.order - expected).abs()).resolving(half_width(&line)).cases(total);
    Ok(Measurement { verdict, remark, evidence, ..measured })
}

/// Half of the 95 % interval of a fitted order.
pub(super) fn half_width(line: &PowerLaw) -> f64 {
    0.5 * (line.interval95[1] - line.interval95[0])
}
