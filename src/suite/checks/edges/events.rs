//! Events at their edges: grazing, coincident, at the start, at a step end, early, late, and none.

use std::collections::BTreeSet;

use super::super::{Subject, Worst, off, worse, worst_of};
use super::{Violations, concrete, end_error, exact, exact_margin, is_right, slab};
use crate::exchange::scene_file::SHIPPED;
use crate::integrators::{
    Boundaries, CentralDifference, Detail, Flight, IntegrationError, Integrator, MethodName, VelocityAt,
};
use crate::physics::{EventKind, Outcome, Problem, Resistance, Scene, Stage};
use crate::studies::relations::reversed;
use crate::studies::{critical_velocity, edge_problems};
use crate::suite::claim::{Found, Measurement, NotMeasured};

check! {
    /// E1 of `verification/edges.toml`.
    GrazingLadder {} in Events, "violations", counting grazing_ladder, compares (Method | FiftyDigits);
    /// E2 of `verification/edges.toml`.
    Scan {} in Events, "violations", counting scan, compares (Method | FiftyDigits);
    /// E3 of `verification/edges.toml`.
    BothCrossings {} in Events, "violations", counting both_crossings, compares (Method | FiftyDigits);
    /// E4 of `verification/edges.toml`.
    ExactlyCritical {} in Events, "violations", counting exactly_critical, compares (Method | FiftyDigits);
    /// E5 of `verification/edges.toml`.
    TripleCoincidence {} in Events, "violations", counting triple_coincidence, compares (Method | FiftyDigits);
    /// E6 of `verification/edges.toml`.
    ThinTargets {} in Events, "violations", counting thin_targets, compares (Method | FiftyDigits);
    /// E7 to E9 of `verification/edges.toml`: a constant force over 1 m from 10 m/s, in stages that end at `ends`.
    StageEnds {
        /// Depths (m), ascending.
        ends: Vec<f64>,
        /// How many events there are.
        events: usize,
    } in Events, "violations", counting stage_ends, compares (Method | FiftyDigits);
    /// E10 of `verification/edges.toml`.
    ScaledForces {} in Events, "promises", by scaled_forces, compares nothing;
    /// E11 of `verification/edges.toml`.
    Plateau {} in Events, "violations", counting plateau, compares (Method | Itself);
    /// E12 of `verification/edges.toml`.
    AtAStepEnd {} in Events, "violations", counting at_a_step_end, compares (Method | FiftyDigits);
    /// E13 of `verification/edges.toml`.
    SmallTimesAndFarStarts {} in Events, "promises", by small_times_and_far_starts, compares (Method | FiftyDigits);
    /// E14 of `verification/edges.toml`.
    VanishingSpeed {} in Events, "promises", by vanishing_speed, compares (Method | FiftyDigits);
    /// E15 of `verification/edges.toml`.
    LawsOutsideTheirRange {} in Events, "ulp", by laws_outside_their_range, compares (Formulas | Itself);
    /// E16 of `verification/edges.toml`.
    ForceJump {} in Events, "promises", by force_jump, compares (Method | FiftyDigits);
    /// E17 of `verification/edges.toml`.
    BackAgain {} in Events, "promises", by back_again, compares (Method | FiftyDigits);
    /// E18 of `verification/edges.toml`.
    AcrossTheCraterEnd {} in Events, "promises", by across_the_crater_end, compares (Method | FiftyDigits);
    /// E19 of `verification/edges.toml`.
    ApproachedForEver {} in Events, "violations", counting approached_for_ever, compares (Method | Itself);
    /// E20 of `verification/edges.toml`.
    MarginOfAStop {} in Events, "error bounds", by margin_of_a_stop, compares (Method | FiftyDigits);
}

/// Widest |margin| at which a method may still be undecided.
fn undecided_max(subject: &Subject<'_>) -> f64 {
    if subject.method_name().needs_diffsol() { 1e-5 } else { 1e-12 }
}

/// Checks outcome and error bound of one solution near V_c.
fn check_outcome(subject: &Subject<'_>, problem: &Problem, seen: &mut Violations) -> Found<Outcome> {
    let margin = exact_margin(problem)?;
    let flight = subject.flight(problem)?;
    seen.expect(is_right(flight.outcome, margin), || {
        format!("{} at V0 = {:e}, margin {margin:e}", flight.outcome, problem.impact_speed)
    });
    let may = margin.abs() <= undecided_max(subject);
    seen.expect(flight.outcome != Outcome::Undecided || may, || format!("undecided at a margin of {margin:e}"));
    let (found, bar) = (flight.exit_margin.unwrap_or(f64::NAN), flight.exit_margin_error.unwrap_or(f64::NAN));
    seen.expect((found - margin).abs() <= bar, || {
        format!("margin {found:e} beyond its error bar {bar:e} of {margin:e} at V0 = {:e}", problem.impact_speed)
    });
    Ok(flight.outcome)
}

fn grazing_ladder(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    for drag in [false, true] {
        let scene = slab(drag);
        let critical = critical_velocity::exact(&scene)?;
        let mut decided = 0;
        for j in 1..=14 {
            let mut both = true;
            for sign in [-1.0, 1.0] {
                let problem = scene.resolve(critical * (1.0 + sign * 10f64.powi(-j)))?;
                both &= check_outcome(subject, &problem, seen)? != Outcome::Undecided;
            }
            if both {
                decided = j;
            }
        }
        // The next numbers on either side, where proofs are open.
        for ulps in -3..=3 {
            check_outcome(subject, &scene.resolve(critical * (1.0 + f64::from(ulps) * f64::EPSILON))?, seen)?;
        }
        seen.notes.push(format!("decided to 1e-{decided} {}", if drag { "with drag" } else { "without drag" }));
    }
    Ok(())
}

fn scan(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    const SIDE: i32 = 250;
    for drag in [false, true] {
        let scene = slab(drag);
        let critical = critical_velocity::exact(&scene)?;
        // From 10 % off to 1e-14 and out again on the other side, ascending.
        let offset = |i: i32| 10f64.powf(-1.0 - 13.0 * f64::from(i) / f64::from(SIDE - 1));
        let below = (0..SIDE).map(|i| 1.0 - offset(i));
        let above = (0..SIDE).rev().map(|i| 1.0 + offset(i));
        let (mut flips, mut last, mut undecided) = (0, None, 0);
        for factor in below.chain(above) {
            let flight = subject.flight(&scene.resolve(critical * factor)?)?;
            if flight.outcome == Outcome::Undecided {
                undecided += 1;
                continue;
            }
            let through = flight.outcome == Outcome::Perforated;
            flips += usize::from(last.is_some_and(|last| last != through));
            seen.expect(through == (factor > 1.0), || format!("{} at V_c (1 {:+e})", flight.outcome, factor - 1.0));
            last = Some(through);
        }
        seen.expect(flips == 1, || format!("{flips} flips"));
        seen.notes.push(format!("{flips} flip, {undecided} undecided"));
    }
    Ok(())
}

fn both_crossings(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    for problem in edge_problems::both_crossings() {
        check_outcome(subject, &problem, seen)?;
    }
    Ok(())
}

fn exactly_critical(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    // Sums and products of powers of two are exact: X = H to the last bit.
    for scale in [1.0, 2f64.powi(-20), 2f64.powi(20)] {
        let problem = Problem::of_stages(2.0, 16.0 * scale, [Stage::tunnel(256.0, 0.0)]).with_exit(scale * scale);
        let flight = subject.flight(&problem)?;
        let outcome = flight.outcome;
        seen.expect(matches!(outcome, Outcome::Perforated | Outcome::Undecided), || format!("{outcome}"));
        check_order(&flight, seen);
        let error = off(flight.end.depth, problem.exit_depth);
        seen.expect(error <= 10.0 * subject.promise(), || format!("ends off H by {error:e}"));
        // Near rest V is the root of an error of W.
        let left = flight.end.velocity / problem.impact_speed;
        seen.expect(left * left <= 1e3 * subject.promise(), || format!("leaves at {left:e} V0"));
    }
    Ok(())
}

fn kinds(flight: &Flight) -> Vec<EventKind> {
    flight.events.iter().map(|event| event.kind).collect()
}

/// Events rise in time and depth, and at one place in the order of their kinds; the last of a flight without speed left is
/// rest.
fn check_order(flight: &Flight, seen: &mut Violations) {
    let at_rest = kinds(flight).last() == Some(&EventKind::Rest);
    seen.expect(at_rest == (flight.end.velocity <= 0.0), || format!("{:?}, and {}", kinds(flight), flight.end));
    for pair in flight.events.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        // An ulp of depth takes less than an ulp of time.
        let rises = a.state.time <= b.state.time && a.state.depth < b.state.depth;
        let at_once = a.state.time == b.state.time && a.state.depth == b.state.depth && a.kind < b.kind;
        seen.expect(rises || at_once, || format!("{a:?} then {b:?}"));
    }
}

fn triple_coincidence(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    use EventKind::{CraterEnd, Exit, Rest};
    for offset in [-1e-6, -1e-12, 0.0, 1e-12, 1e-6] {
        // c = P/(k d), Q = 0: V0 = 1 comes to rest at 1 m = k d = H.
        let problem = concrete(1.0, 1.0 + offset, [1.0, 1.0], [1.0, 0.0]).with_exit(1.0);
        let flight = subject.flight(&problem)?;
        let found = kinds(&flight);
        check_order(&flight, seen);
        let allowed: &[&[EventKind]] = match flight.outcome {
            Outcome::Perforated => &[&[CraterEnd, Exit], &[CraterEnd, Exit, Rest]],
            Outcome::StoppedInCrater | Outcome::StoppedInTunnel => &[&[Rest]],
            _ => &[&[CraterEnd, Exit], &[CraterEnd, Exit, Rest], &[Rest], &[CraterEnd, Rest]],
        };
        seen.expect(allowed.contains(&found.as_slice()), || format!("{} with {found:?} at {offset:e}", flight.outcome));
        let right = match flight.outcome {
            Outcome::Undecided => 4.0 * offset.abs() <= undecided_max(subject),
            Outcome::Perforated => offset >= 0.0,
            _ => offset < 0.0,
        };
        seen.expect(right, || format!("{} at {offset:e}", flight.outcome));
    }
    Ok(())
}

fn thin_targets(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let scene = slab(true);
    let problem = scene.resolve(400.0)?;
    let depth = problem.stages[0].end;
    for exit in [0.0, 1e-300, 1e-30].into_iter().chain(edge_problems::thin_exits(depth)) {
        // The library's steps end at times of about 1e-302 s: it reports so, and there is no solution to judge.
        if exit == 1e-300 && subject.method_name().needs_diffsol() {
            continue;
        }
        let thin = Problem { exit_depth: exit, ..problem.clone() };
        let flight = subject.flight(&thin)?;
        seen.expect(flight.outcome == Outcome::Perforated, || format!("{} at H = {exit:e}", flight.outcome));
        let found = kinds(&flight);
        let expected = if exit < depth { vec![EventKind::Exit] } else { vec![EventKind::CraterEnd, EventKind::Exit] };
        seen.expect(found == expected, || format!("{found:?} at H = {exit:e}"));
        seen.expect(flight.end.depth == exit, || format!("leaves at {:e} of {exit:e}", flight.end.depth));
        if exit == 0.0 {
            seen.expect(flight.end.velocity == 400.0 && flight.end.time == 0.0, || format!("{}", flight.end));
        } else {
            let error = (flight.end.velocity - exact(&thin)?.end.velocity.hi()).abs() / 400.0;
            seen.expect(error <= 1e3 * subject.promise(), || format!("V_r off by {error:e} at H = {exit:e}"));
        }
        check_order(&flight, seen);
    }
    Ok(())
}

fn stage_ends(StageEnds { ends, events }: &StageEnds, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    holds!(ends.is_sorted(), "the stages do not end one behind the other");
    let problem = edge_problems::stage_ends(ends);
    let flight = subject.flight(&problem)?;
    let exact = exact(&problem)?.values();
    let (found, expected) = (kinds(&flight), kinds(&exact));
    seen.expect(expected.len() == *events, || format!("the case itself has {} events", expected.len()));
    seen.expect(found == expected, || format!("{found:?}"));
    check_order(&flight, seen);
    for (event, exact) in flight.events.iter().zip(&exact.events) {
        let time = (event.state.time - exact.state.time).abs() / exact.state.time.max(f64::MIN_POSITIVE);
        let speed = (event.state.velocity - exact.state.velocity).abs() / problem.impact_speed;
        seen.expect(worse(time, speed) <= 1e3 * subject.promise(), || {
            format!("{:?} off by {time:e} in time, {speed:e} in speed", event.kind)
        });
    }
    seen.expect(flight.cost.steps < 10_000, || format!("{} steps", flight.cost.steps));
    Ok(())
}

fn scaled_forces(subject: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    for exit in [f64::INFINITY, 0.75] {
        // Powers of two throughout, so that no scaling rounds.
        let plain = concrete(1.0, 2.0, [8.0, 0.5], [4.0, 0.25]).with_exit(exit);
        let base = subject.flight(&plain)?;
        for power in [-1000, -560, -100, 100, 980] {
            let scale = |x: f64| x * 2f64.powi(power);
            let problem = concrete(scale(1.0), 2.0, [scale(8.0), 0.5], [4.0, 0.25].map(scale)).with_exit(exit);
            let flight = subject.flight(&problem)?;
            let is_same = flight.outcome.agrees_with(base.outcome) && kinds(&flight) == kinds(&base);
            holds!(is_same, "{} became {} at 2^{power}", base.outcome, flight.outcome);
            worst = worse(worst, end_error(&flight, &base, 2.0));
        }
    }
    let subnormal =
        Scene { mass: 1e-310, resistance: Resistance::Stages(vec![Stage::tunnel(1e-310, 0.0)]), ..slab(false) };
    holds!(subnormal.problem().is_err(), "subnormal mass and force are taken");
    Ok(Measurement::new(worst / subject.promise()))
}

/// What a stop lacks is continued through the rest of its stage, with `y = 2 q xi/M` up to q/5.
fn margin_of_a_stop(subject: &Subject<'_>) -> Found {
    let mut worst = Worst::default();
    for drag in [0.1, 1.0, 3.0, 7.0, 14.0, 40.0] {
        for speed in [30.0, 120.0, 300.0] {
            let law = Stage { static_force: 3e5, stiffness: 5e6, drag, ..Stage::free() };
            let problem = Problem::of_stages(2.0, speed, [law]).with_exit(0.2);
            let flight = subject.flight(&problem)?;
            holds!(flight.outcome.is_stop(), "{} at {speed} m/s with {drag} kg/m", flight.outcome);
            let (Some(margin), Some(bound)) = (flight.exit_margin, flight.exit_margin_error) else {
                return Err(NotMeasured::broken("no exit margin with an error bound"));
            };
            worst.take((margin - exact_margin(&problem)?).abs() / bound, || format!("at {speed} m/s with {drag} kg/m"));
        }
    }
    Ok(worst.measurement())
}

/// A spring of 1 kN/m over half a metre, then 1 kg/s over another, 1 kg: V_c² = s (1/2)² + (r/2)².
fn approached_for_ever(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let spring = Stage { stiffness: 1e3, end: 0.5, ..Stage::free() };
    let slowing = Stage { viscosity: 1.0, ..Stage::free() };
    let at = |speed| Problem::of_stages(1.0, speed, [spring, slowing]).with_exit(1.0);
    let critical = 250.25_f64.sqrt();
    let method = subject.method(None)?;
    for power in 1..=14 {
        for sign in [1.0, -1.0] {
            let said = method.integrator().solve(&at(critical * (1.0 + sign * 10f64.powi(-power))), Detail::Events);
            let right = match &said {
                Ok(flight) if flight.outcome == Outcome::Undecided => power > 2,
                // From a thousandth below V_c down the spring stops it.
                Ok(flight) => (flight.outcome == Outcome::Perforated) == (sign > 0.0),
                Err(error) => matches!(error, IntegrationError::NeverEnds { .. }) && sign < 0.0,
            };
            seen.expect(right, || format!("{sign}e-{power}: {:?}", said.map(|flight| flight.outcome)));
        }
    }
    let found = critical_velocity::critical_velocity(|speed| Ok(at(speed)), method.integrator())?;
    seen.expect((found.velocity - critical).abs() <= found.error_bar.unwrap_or(0.0), || {
        format!("V_c {} +- {:?}", found.velocity, found.error_bar)
    });
    // Behind the spring one of 1 N/m that drives towards 0.75 m, with 10 kg/s: slower than 2.4 m/s it is only approached.
    let creeping = Stage { static_force: -0.75, stiffness: 1.0, viscosity: 10.0, ..Stage::free() };
    for entry in [1e-3_f64, 0.1, 0.5, 1.0, 2.0, 2.4] {
        let problem = Problem::of_stages(1.0, (entry * entry + 250.0_f64).sqrt(), [spring, creeping]).with_exit(1.0);
        let said = method.integrator().solve(&problem, Detail::Events);
        let right = match &said {
            Ok(flight) => flight.outcome == Outcome::Undecided,
            Err(error) => matches!(error, IntegrationError::NeverEnds { .. }),
        };
        seen.expect(right, || format!("creeps from {entry} m/s: {:?}", said.map(|flight| flight.outcome)));
    }
    Ok(())
}

fn plateau(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let gap = Stage::free().until(1.0);
    let open = Stage::free();
    let flight = subject.flight(&Problem::of_stages(1.0, 3.0, [gap, open]).with_exit(2.0))?;
    let error = worse((flight.end.time * 1.5 - 1.0).abs(), off(flight.end.velocity, 3.0));
    seen.expect(flight.outcome == Outcome::Perforated, || format!("{}", flight.outcome));
    seen.expect(error <= 1e3 * subject.promise(), || format!("off by {error:e}"));
    seen.expect(kinds(&flight) == [EventKind::StageEnd(0), EventKind::Exit], || format!("{:?}", kinds(&flight)));
    let endless = Problem::of_stages(1.0, 3.0, [open]);
    let said = subject.method(None)?.integrator().solve(&endless, Detail::Events);
    seen.expect(matches!(said, Err(IntegrationError::NeverEnds { .. })), || format!("{said:?}"));
    // Then a wall: nothing has been lost before it.
    let flight = subject.flight(&Problem::of_stages(1.0, 3.0, [gap, Stage::tunnel(9.0, 0.0)]))?;
    let error = off(flight.end.depth, 1.5);
    seen.expect(error <= 1e3 * subject.promise(), || format!("stops off by {error:e}"));
    Ok(())
}

fn at_a_step_end(_: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let dt = 2f64.powi(-10);
    for velocity in VelocityAt::ALL {
        for boundaries in Boundaries::ALL {
            let scheme = CentralDifference::uniform(dt, velocity, boundaries);
            let free = Stage::free().until(0.25);
            let problem = Problem::of_stages(1.0, 1.0, [free, Stage::free()]).with_exit(0.5);
            let flight = scheme.solve(&problem, Detail::Trajectory)?;
            let name = format!("{velocity}, {boundaries}");
            seen.expect(kinds(&flight) == [EventKind::StageEnd(0), EventKind::Exit], || {
                format!("{name}: {:?}", kinds(&flight))
            });
            let times: Vec<f64> = flight.events.iter().map(|event| event.state.time).collect();
            seen.expect(times == [0.25, 0.5], || format!("{name}: {times:?}"));
            // One row a step; an event at a step end may add its own at the same time, with the next stage's force.
            let rises = flight.trajectory.windows(2).all(|w| {
                w[0].state.time < w[1].state.time || (w[0].state.time == w[1].state.time && w[0].stage <= w[1].stage)
            });
            seen.expect(rises, || format!("{name}: times fall"));
            // Rest exactly at a node: V = 1 - 2 t at t = 0.5, x = 0.25.
            let stop = Problem::of_stages(1.0, 1.0, [Stage::tunnel(2.0, 0.0)]);
            let flight = scheme.solve(&stop, Detail::Events)?;
            seen.expect(kinds(&flight) == [EventKind::Rest], || format!("{name}: {:?}", kinds(&flight)));
            seen.expect((flight.end.time, flight.end.depth) == (0.5, 0.25), || format!("{name}: {}", flight.end));
        }
    }
    Ok(())
}

fn small_times_and_far_starts(subject: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    let tiny = edge_problems::tiny().ok_or_else(|| NotMeasured::broken("the slab has no problem"))?;
    let far =
        Problem::of_stages(1.0, 300.0, [Stage::free().until(1e6), Stage::tunnel(1.2e5, 0.5)]).with_exit(1e6 + 0.25);
    // An ulp of the depth counts 4e6 times in the quarter of a metre behind 1e6 m.
    for (problem, condition) in [(tiny, 1.0), (far, 4e6)] {
        let (flight, exact) = subject.beside_exact(&problem)?;
        let margin = (flight.exit_margin.unwrap_or(f64::NAN) - exact_margin(&problem)?).abs();
        worst = worst_of([worst, off(flight.end.time, exact.end.time) / condition, margin / condition]);
    }
    Ok(Measurement::new(worst / subject.promise()))
}

fn vanishing_speed(subject: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    for power in [0, -3, -6, -9, -12, -20, -30] {
        let speed = 10f64.powi(power);
        let flight = subject.flight(&Problem::of_stages(2.0, speed, [Stage::tunnel(1e5, 3.0)]))?;
        let depth = off(flight.end.depth, speed * speed / 1e5);
        let time = off(flight.end.time, 2.0 * speed / 1e5);
        // The drag takes Q V0²/(2 P) of the depth, which counts at the first speeds.
        let drag = 3.0 * speed * speed / 1e5;
        worst = worse(worst, (worse(depth, time) - drag).max(0.0));
    }
    Ok(Measurement::new(worst / subject.promise()))
}

fn laws_outside_their_range(_: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    for (name, text) in SHIPPED {
        let scene = Scene::from_toml(text, name)?;
        // The coefficients of a law of its own are NaN.
        for stage in scene.problem()?.stages.iter().filter(|stage| !stage.static_force.is_nan()) {
            for x in [-1e3, -1e-3, 0.0, 0.1, 1e3] {
                for v in [-1e3, -1e-9, 0.0, 1e-9, 1e3] {
                    let terms = [stage.static_force, stage.stiffness * x, stage.viscosity * v, stage.drag * v * v];
                    let size = terms.iter().fold(f64::MIN_POSITIVE, |a: f64, b| a.max(b.abs()));
                    let plain: f64 = terms.iter().sum();
                    worst = worse(worst, (stage.force(x, v) - plain).abs() / size / f64::EPSILON);
                }
            }
        }
    }
    Ok(Measurement::new(worst))
}

fn force_jump(subject: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    for problem in edge_problems::force_jumps() {
        let (flight, exact) = subject.beside_exact(&problem)?;
        worst = worse(worst, end_error(&flight, &exact, problem.impact_speed));
        if let Some((found, end)) = flight.crater_end().zip(exact.crater_end()) {
            let speed = (found.velocity - end.velocity).abs() / problem.impact_speed;
            worst = worst_of([worst, off(found.time, end.time), speed]);
        }
    }
    Ok(Measurement::new(worst / subject.promise()))
}

fn back_again(subject: &Subject<'_>) -> Found {
    // In the direction back drag is negative, for which there is no closed form.
    let drag = subject.method_name() != MethodName::ClosedForm;
    let problem = slab(drag).resolve(600.0)?;
    let there = subject.flight(&problem)?;
    let back = reversed(&problem, &there).ok_or_else(|| NotMeasured::broken("the projectile does not leave"))?;
    let again = subject.flight(&back)?;
    let places: BTreeSet<_> = again.events.iter().map(|event| event.kind).collect();
    let right = BTreeSet::from([EventKind::StageEnd(0), EventKind::Exit]);
    holds!(places == right, "in the direction back {places:?}");
    let speed = off(again.end.velocity, problem.impact_speed);
    let time = off(again.end.time, there.end.time);
    Ok(Measurement::new(worse(speed, time) / subject.promise()))
}

fn across_the_crater_end(subject: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    for problem in edge_problems::across_the_crater_end() {
        let (flight, exact) = subject.beside_exact(&problem)?;
        worst = worst_of([worst, off(flight.end.depth, exact.end.depth), off(flight.end.time, exact.end.time)]);
    }
    Ok(Measurement::new(worst / subject.promise()))
}
