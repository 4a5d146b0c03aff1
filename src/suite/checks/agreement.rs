//! A method beside the exact answer, beside another method; outcomes and events.

use super::super::claim::{Claim, Measurement, NotMeasured};
use super::super::verdict::Verdict;
use super::{Context, Subject, build, fly};
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{Detail, Flight};
use crate::physics::reference::{self, Source};
use crate::physics::{EventKind, Outcome};
use crate::studies::critical_velocity;
use crate::studies::error::{flight_error, is_fixed, signed_error, value_of};
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;
use crate::studies::random_scenes;

/// Closed form against the 50-digit reference: worst error in ulp over max(1, condition number), over the claim's
/// scene and `random` more.
pub(super) fn reference(claim: &Claim, context: Context<'_>, random: usize) -> Result<Measurement, NotMeasured> {
    let mut worst = (0.0_f64, String::new());
    let mut take = |error: f64, what: String| {
        if error.is_nan() || error > worst.0 {
            worst = (error, what);
        }
    };
    if let Some(name) = &claim.scene {
        let scene = context.scenes.get(name).ok_or_else(|| NotMeasured::broken(format!("no scene {name}")))?;
        let errors = random_scenes::closed_form_errors(scene).map_err(NotMeasured::broken)?;
        let error = errors.worst().ok_or_else(|| NotMeasured::skip("the stages have no reference"))?;
        take(error.0, format!("{} of {name}", error.1.name()));
    }
    let mut scenes = random_scenes::Generator::new(context.seed, "reference");
    for index in 0..random {
        let scene = scenes.next_scene();
        let errors = random_scenes::closed_form_errors(&scene).map_err(NotMeasured::broken)?;
        if let Some((error, quantity)) = errors.worst() {
            take(error, format!("{} of random scene {index}", quantity.name()));
        }
    }
    Ok(Measurement::new(worst.0).remark(format!("worst: {}", worst.1)))
}

/// Relative error of the claim's method against the exact answer, over max(1, condition number).
pub(super) fn with_exact(subject: &Subject<'_>, rtol: Option<f64>) -> Result<Measurement, NotMeasured> {
    let quantity = subject.quantity()?;
    let method = subject.method(rtol)?;
    if quantity == Quantity::CriticalVelocity {
        return critical(subject, &method);
    }
    let yardstick = subject.yardstick()?;
    if !yardstick.is_closed_form && subject.method_name() == MethodName::Taylor {
        return Err(NotMeasured::skip("no closed form, and the refined answer is the method's own"));
    }
    let exact = &yardstick.flight;
    if is_fixed(quantity, exact) {
        return Err(NotMeasured::skip("the scene fixes this quantity"));
    }
    let flight = subject.fly(&method, Detail::Events)?;
    if flight.outcome == Outcome::Undecided {
        let remark = format!("undecided: margin {:?} within {:?}", flight.exit_margin, flight.exit_margin_error);
        return Ok(Measurement::new(f64::NAN).verdict(Verdict::Undecided).remark(remark));
    }
    let error = flight_error(quantity, &flight, exact, subject.problem.impact_speed)
        .ok_or_else(|| NotMeasured::broken(format!("{} where {} is right", flight.outcome, exact.outcome)))?;
    let condition = reference::conditions(Source::Problem(&subject.problem))
        .ok()
        .and_then(|c| random_scenes::condition_of(&c, quantity))
        .map_or(1.0, |c| c.max(1.0));
    let value = value_of(quantity, &flight).unwrap_or(f64::NAN);
    let mut remark = format!("{value} with {} evaluations, error {:.1e}", flight.cost.force_evaluations, error.abs());
    if condition > 1.0 {
        remark.push_str(&format!(", condition {condition:.1}"));
    }
    Ok(Measurement::new(error.abs() / condition).remark(remark))
}

fn critical(subject: &Subject<'_>, method: &Method) -> Result<Measurement, NotMeasured> {
    if !subject.problem.has_exit() {
        return Err(NotMeasured::skip("a target without a far side has no critical velocity"));
    }
    let exact = critical_velocity::exact(subject.scene)
        .map_err(|error| NotMeasured::skip(format!("no closed form of the critical velocity: {error}")))?;
    let found = critical_velocity::of_scene(subject.scene, method.integrator()).map_err(|error| {
        if error.is_usage() { NotMeasured::skip(error.to_string()) } else { NotMeasured::broken(error) }
    })?;
    let error = signed_error(Quantity::CriticalVelocity, found.velocity, exact, 1.0);
    Ok(Measurement::new(error.abs()).remark(format!("{} m/s after {} flights", found.velocity, found.evaluations)))
}

/// Relative difference of the claim's quantity from the number that the claim states.
pub(super) fn stated(subject: &Subject<'_>, stated: f64) -> Result<Measurement, NotMeasured> {
    let quantity = subject.quantity()?;
    let method = subject.method(None)?;
    let value = if quantity == Quantity::CriticalVelocity {
        critical_velocity::of_scene(subject.scene, method.integrator()).map_err(NotMeasured::broken)?.velocity
    } else {
        let flight = subject.fly(&method, Detail::Events)?;
        value_of(quantity, &flight).ok_or_else(|| NotMeasured::broken(format!("{} has none", flight.outcome)))?
    };
    Ok(Measurement::new((value / stated - 1.0).abs()).remark(format!("{value}, stated {stated}")))
}

/// Worst error of the exit margin over its error bar at `points` impact speeds about the critical velocity.
///
/// Against the reference of the same stages: what a scene's numbers lose on their way into stages is no part of the bar.
pub(super) fn margin(subject: &Subject<'_>, points: usize) -> Result<Measurement, NotMeasured> {
    let method = subject.method(None)?;
    let critical = critical_velocity::exact_or_refined(subject.scene).map_err(NotMeasured::broken)?;
    let mut random = Random::for_part(subject.context.seed, "margin");
    let mut worst = (0.0_f64, 0.0);
    for _ in 0..points {
        let speed = critical * random.log_uniform(0.2, 5.0);
        let problem = subject.scene.resolve(speed).map_err(NotMeasured::broken)?;
        let exact = reference::flight(Source::Problem(&problem)).map_err(NotMeasured::broken)?;
        let flight = fly(&method, &problem, Detail::End)?;
        if !(flight.outcome == Outcome::Undecided || flight.outcome.agrees_with(exact.outcome)) {
            let remark = format!("{} at {speed} m/s, where {} is right", flight.outcome, exact.outcome);
            return Err(NotMeasured::broken(remark));
        }
        let (Some(margin), Some(bar), Some(exact)) = (flight.exit_margin, flight.exit_margin_error, exact.exit_margin)
        else {
            return Err(NotMeasured::skip("no exit margin with an error bar"));
        };
        let error = exact.error_over(margin, &reference::Exact::one()) / bar;
        if error.is_nan() || error > worst.0 {
            worst = (error, speed);
        }
    }
    Ok(Measurement::new(worst.0).remark(format!("worst at {:.3} m/s, V_c is {critical:.3} m/s", worst.1)))
}

/// 0 when the outcome is `is` or undecided, 1 when it is wrong.
pub(super) fn outcome(subject: &Subject<'_>, is: &str) -> Result<Measurement, NotMeasured> {
    let flight = subject.fly(&subject.method(None)?, Detail::End)?;
    let right = flight.outcome.name() == is || flight.outcome == Outcome::Undecided;
    Ok(Measurement::new(if right { 0.0 } else { 1.0 })
        .remark(format!("{}, margin {:?} +- {:?}", flight.outcome, flight.exit_margin, flight.exit_margin_error)))
}

/// Difference of two methods over the tolerance that both may claim.
pub(super) fn pair(subject: &Subject<'_>, with: MethodName, tolerance: f64) -> Result<Measurement, NotMeasured> {
    let quantity = subject.quantity()?;
    if subject.method_name() == with {
        return Err(NotMeasured::skip("a method agrees with itself"));
    }
    let one = subject.fly(&subject.method(None)?, Detail::Events)?;
    let other = fly(&build(with, &MethodOptions::default())?, &subject.problem, Detail::Events)?;
    if is_fixed(quantity, &other) {
        return Err(NotMeasured::skip("the scene fixes this quantity"));
    }
    let error = flight_error(quantity, &one, &other, subject.problem.impact_speed)
        .ok_or_else(|| NotMeasured::broken(format!("{} against {}", one.outcome, other.outcome)))?;
    Ok(Measurement::new(error.abs() / tolerance).remark(format!("difference {:.1e} from {with}", error.abs())))
}

/// Violations of order, place and number among the events of a flight.
pub(super) fn event_order(subject: &Subject<'_>) -> Result<Measurement, NotMeasured> {
    let flight = subject.fly(&subject.method(None)?, Detail::Events)?;
    let faults = faults(subject, &flight);
    Ok(Measurement::new(faults.len() as f64).remark(if faults.is_empty() {
        let names: Vec<_> = flight.events.iter().map(|e| e.kind.name()).collect();
        names.join(", ")
    } else {
        faults.join("; ")
    }))
}

fn faults(subject: &Subject<'_>, flight: &Flight) -> Vec<String> {
    let problem = &subject.problem;
    let mut faults = Vec::new();
    for pair in flight.events.windows(2) {
        if !(pair[0].state.time <= pair[1].state.time && pair[0].state.depth <= pair[1].state.depth) {
            faults.push(format!("{} does not come before {}", pair[0].kind.name(), pair[1].kind.name()));
        }
    }
    // Every stage end up to the end of the flight, once, at its depth.
    for index in 0..problem.stages.len() {
        let end = problem.stages[index].end;
        let kind = EventKind::boundary(problem, index);
        let times = flight.events.iter().filter(|e| e.kind == kind).count();
        let reached = end <= flight.end.depth && end <= problem.exit_depth;
        if times != usize::from(reached) {
            faults.push(format!("end of stage {index} listed {times} times"));
        }
        if let Some(state) = flight.at(kind)
            && state.depth != end
        {
            faults.push(format!("end of stage {index} at {} and not at {end}", state.depth));
        }
    }
    let exits = flight.events.iter().filter(|e| e.kind == EventKind::Exit).count();
    if exits != usize::from(flight.outcome == Outcome::Perforated) {
        faults.push(format!("exit listed {exits} times"));
    }
    let rests = flight.events.iter().filter(|e| e.kind == EventKind::Rest).count();
    if rests != usize::from(flight.end.velocity == 0.0) {
        faults.push(format!("rest listed {rests} times"));
    }
    faults
}
