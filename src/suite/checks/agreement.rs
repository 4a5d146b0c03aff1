//! A method beside the exact answer, beside another method; outcomes and events.

use super::super::claim::{Found, Measurement, NotMeasured};
use super::{FIXED, NO_FAR_SIDE, Subject, Worst, build, off, refusal_or_failure, solve};
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{Detail, Flight};
use crate::physics::reference::{self, Source};
use crate::physics::{self, EventKind, Problem};
use crate::studies::critical_velocity;
use crate::studies::error::{Truth, condition_of, flight_error, is_fixed, signed_error, value_of};
use crate::studies::quantity::Quantity;
use crate::studies::random_scenes;
use crate::suite::recorded::shipped;
use crate::text::or_dash;

check! {
    /// Closed form against the 50-digit reference, over the claim's scene and `random` more drawn from the seed; worst
    /// error in ulp over max(1, condition number).
    Reference {
        /// Random scenes besides those named.
        #[serde(default)]
        random: usize,
    } in Exact, "ulp x condition", by reference, compares (ClosedForm Loop | FiftyDigits);
    /// Method against the exact answer; relative error over max(1, condition number).
    Agreement {
        /// Relative tolerance of the method.
        rtol: Option<f64>,
    } in Exact, "relative x condition", by with_exact, compares (Method | Truth);
    /// The claim's quantity of its scene against a number stated in the suite: published, measured, or computed
    /// elsewhere; relative difference.
    Stated {
        /// The number, in SI units.
        value: f64,
    } in Exact, "relative", by stated, compares (Method | Elsewhere);
    /// Exit margin and outcome against 50 digits at `points` impact speeds from a fifth of the critical velocity to
    /// five times it: worst error of the margin over its error bound. A wrong outcome that is not `undecided` breaks it.
    Margin {
        /// How many, log-uniform from the seed.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        points: usize,
    } in Events, "error bars", by margin, compares (Method | FiftyDigits);
    /// Outcome of the method: 0 if it is right, 1 if it is wrong; undecided where the method is.
    Outcome {
        /// The right outcome.
        is: physics::Outcome,
    } in Events, "wrong outcomes", by outcome, compares (Method | Elsewhere);
    /// One method against another; difference over the tolerance that both may claim.
    Pair {
        /// The other method.
        with: MethodName,
        /// Tolerance that each may claim, relative.
        #[serde(deserialize_with = "crate::suite::checks::positive")]
        tolerance: f64,
    } in CrossCode, "tolerance", by pair, compares (Method | OtherMethod);
    /// Events in time order, each at its place, none missing or twice; number of violations.
    EventOrder {} in Events, "violations", by event_order, compares nothing;
}

fn reference(&Reference { random }: &Reference, subject: &Subject<'_>) -> Found {
    let mut worst = Worst::default();
    if let Some(name) = subject.named_scene() {
        let errors = random_scenes::closed_form_errors(subject.scene()?)?;
        let (error, quantity) = errors.worst().ok_or_else(|| NotMeasured::skip("the stages have no reference"))?;
        worst.take(error, || format!("in the {quantity} of {name}"));
    }
    let mut scenes = random_scenes::Generator::new(subject.context.seed, "reference");
    for index in 0..random {
        if let Some((error, quantity)) = random_scenes::closed_form_errors(&scenes.next_scene())?.worst() {
            worst.take(error, || format!("in the {quantity} of random scene {index}"));
        }
    }
    Ok(worst.measurement().resolving(1.0))
}

fn with_exact(&Agreement { rtol }: &Agreement, subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let quantity = subject.quantity()?;
    let method = subject.method(rtol)?;
    if quantity == Quantity::CriticalVelocity {
        return critical(subject, &method);
    }
    let Truth { flight: exact, is_exact } = &subject.truth()?;
    applies!(!is_fixed(quantity, exact), "{FIXED}");
    let is_independent = *is_exact || subject.method_name() != MethodName::Taylor;
    applies!(is_independent, "no exact answer, and the refined one is the method's own");
    let flight = solve(&method, problem, Detail::Events)?;
    must_be_decided(&flight)?;
    holds!(flight.outcome.agrees_with(exact.outcome), "{} where {} is right", flight.outcome, exact.outcome);
    let exact = value_of(quantity, exact)
        .ok_or_else(|| NotMeasured::broken(format!("the exact solution has no {quantity}")))?;
    let found = value_of(quantity, &flight)
        .ok_or_else(|| NotMeasured::broken(format!("no {quantity}, where {exact} is right")))?;
    let error = signed_error(quantity, found, exact, problem.impact_speed);
    let compute = || reference::conditions(Source::Problem(problem)).ok();
    let conditions = subject.context.memo.conditions.get(subject.scene_name()?.to_owned(), compute);
    let condition = conditions.map_or(1.0, |conditions| condition_of(&conditions, quantity));
    let mut remark = format!("{found} with {} evaluations, error {:.1e}", flight.cost.force_evaluations, error.abs());
    if condition > 1.0 {
        remark.push_str(&format!(", condition {condition:.1}"));
    }
    Ok(Measurement::new(error.abs() / condition).remark(remark))
}

fn critical(subject: &Subject<'_>, method: &Method) -> Found {
    applies!(subject.problem()?.has_exit(), "{NO_FAR_SIDE}");
    let exact = match shipped(subject.scene_name()?).and_then(|scene| scene.number("critical_velocity_m_s")) {
        Some(exact) => exact,
        None => critical_velocity::exact(subject.scene()?)
            .map_err(|error| NotMeasured::skip(format!("no closed form of the critical velocity: {error}")))?,
    };
    let found = critical_velocity::of_scene(subject.scene()?, method.integrator()).map_err(refusal_or_failure)?;
    let error = signed_error(Quantity::CriticalVelocity, found.velocity, exact, 1.0);
    Ok(Measurement::new(error.abs()).remark(format!("{} m/s after {} solutions", found.velocity, found.evaluations)))
}

fn stated(&Stated { value: stated }: &Stated, subject: &Subject<'_>) -> Found {
    holds!(stated.is_finite(), "{stated} is stated, from which nothing is far");
    let quantity = subject.quantity()?;
    let value = if quantity == Quantity::CriticalVelocity {
        let method = subject.method(None)?;
        critical_velocity::of_scene(subject.scene()?, method.integrator())?.velocity
    } else {
        let flight = subject.solution(Detail::Events)?;
        must_be_decided(&flight)?;
        value_of(quantity, &flight).ok_or_else(|| NotMeasured::broken(format!("{} has none", flight.outcome)))?
    };
    Ok(Measurement::new(off(value, stated)).remark(format!("{value}, stated {stated}")))
}

/// The reference is that of the same stages: the error bound does not cover the rounding of a scene into stages.
fn margin(&Margin { points }: &Margin, subject: &Subject<'_>) -> Found {
    let method = subject.method(None)?;
    let critical = critical_velocity::exact_or_refined(subject.scene()?)?;
    let mut random = subject.random("margin");
    let mut worst = Worst::default();
    for _ in 0..points {
        let speed = critical * random.log_uniform(0.2, 5.0);
        let problem = subject.scene()?.resolve(speed)?;
        if !problem.laws.is_empty() {
            return Err(NotMeasured::skip("no reference of 50 digits knows a law of its own"));
        }
        let exact = reference::flight(Source::Problem(&problem))?;
        let flight = solve(&method, &problem, Detail::End)?;
        let is_right = flight.outcome == physics::Outcome::Undecided || flight.outcome.agrees_with(exact.outcome);
        holds!(is_right, "{} at {speed} m/s, where {} is right", flight.outcome, exact.outcome);
        let (Some(margin), Some(bar), Some(exact)) = (flight.exit_margin, flight.exit_margin_error, exact.exit_margin)
        else {
            return Err(NotMeasured::skip("no exit margin with an error bound"));
        };
        let error = exact.error_over(margin, &reference::Exact::one()) / bar;
        worst.take(error, || format!("at {speed:.3} m/s, V_c is {critical:.3} m/s"));
    }
    Ok(worst.measurement())
}

/// Leaves open what is claimed of an undecided flight.
fn must_be_decided(flight: &Flight) -> Found<()> {
    match flight.outcome {
        physics::Outcome::Undecided => Err(NotMeasured::undecided(format!("undecided: {}", margin_of(flight)))),
        _ => Ok(()),
    }
}

/// `margin 5e-15 +- 2e-15`.
fn margin_of(flight: &Flight) -> String {
    let Some(margin) = flight.exit_margin else { return "no margin".to_owned() };
    format!("margin {margin:.2e} +- {}", or_dash(flight.exit_margin_error, |error| format!("{error:.2e}")))
}

fn outcome(&Outcome { is }: &Outcome, subject: &Subject<'_>) -> Found {
    let flight = subject.solution(Detail::End)?;
    if is != physics::Outcome::Undecided {
        must_be_decided(&flight)?;
    }
    let remark = format!("{}, {}", flight.outcome, margin_of(&flight));
    Ok(Measurement::count(usize::from(flight.outcome != is)).remark(remark))
}

fn pair(&Pair { with, tolerance }: &Pair, subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let quantity = subject.quantity()?;
    applies!(subject.method_name() != with, "a method agrees with itself");
    let one = subject.solution(Detail::Events)?;
    let other = solve(&build(with, &MethodOptions::default())?, problem, Detail::Events)?;
    [&one, &other].into_iter().try_for_each(must_be_decided)?;
    applies!(!is_fixed(quantity, &other), "{FIXED}");
    let is_one_solver = [subject.method_name(), with].contains(&MethodName::Adaptive) && one.end == other.end;
    applies!(!is_one_solver, "adaptive solves this scene by the other method");
    let error = flight_error(quantity, &one, &other, problem.impact_speed)
        .ok_or_else(|| NotMeasured::broken(format!("{} against {}", one.outcome, other.outcome)))?;
    let resolution = f64::EPSILON / tolerance;
    Ok(Measurement::new(error.abs() / tolerance)
        .resolving(resolution)
        .remark(format!("difference {:.1e} from {with}", error.abs())))
}

fn event_order(subject: &Subject<'_>) -> Found {
    let flight = subject.solution(Detail::Events)?;
    must_be_decided(&flight)?;
    let faults = faults(subject.problem()?, &flight);
    let names = flight.events.iter().map(|e| e.kind.name()).collect::<Vec<_>>();
    let remark = if faults.is_empty() { names.join(", ") } else { faults.join("; ") };
    Ok(Measurement::count(faults.len()).remark(remark))
}

/// Violations of order, place and number among the events of `flight`.
fn faults(problem: &Problem, flight: &Flight) -> Vec<String> {
    let mut faults = Vec::new();
    for pair in flight.events.windows(2) {
        if !(pair[0].state.time <= pair[1].state.time && pair[0].state.depth <= pair[1].state.depth) {
            faults.push(format!("{} does not come before {}", pair[0].kind.name(), pair[1].kind.name()));
        }
    }
    // Every stage end up to the end of the motion, once, at its depth; that where a plug breaks off has its name.
    for index in 0..problem.stages.len() {
        let end = problem.stages[index].end;
        let kind = EventKind::boundary(problem, index);
        let times = flight.events.iter().filter(|e| e.kind == kind).count();
        // A stage that ends at a speed or on a condition has no place.
        let has_place = end.is_finite();
        if !has_place && flight.at(EventKind::Plug).is_some() {
            continue;
        }
        let reached =
            if has_place { end <= flight.end.depth && end <= problem.exit_depth } else { index < flight.stage };
        if times != usize::from(reached) {
            faults.push(format!("end of stage {index} listed {times} times"));
        }
        if has_place
            && let Some(state) = flight.at(kind)
            && state.depth != end
        {
            faults.push(format!("end of stage {index} at {} and not at {end}", state.depth));
        }
    }
    let ends = [
        (EventKind::Exit, flight.outcome == physics::Outcome::Perforated),
        (EventKind::Rest, flight.end.velocity == 0.0),
    ];
    for (kind, is_there) in ends {
        let times = flight.events.iter().filter(|event| event.kind == kind).count();
        if times != usize::from(is_there) {
            faults.push(format!("{} listed {times} times", kind.name()));
        }
    }
    faults
}
