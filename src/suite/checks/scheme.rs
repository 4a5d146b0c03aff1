//! What the central difference must do at any step, and its error constants (docs/theory.md, section 5).

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::{Subject, off, worst_of};
use crate::integrators::central_difference::stability_limit as stability_limit_of;
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, Integrator, VelocityAt};
use crate::physics::{Outcome, Problem, Stage, State};
use crate::studies::order::try_bisect;
use crate::studies::quantity::Quantity;
use crate::studies::{rounding, stability};

check! {
    /// Central difference in the crater or at Q = 0: worst distance from the exact discrete solution over the amplitude.
    DiscreteSolution {
        /// w dt in the crater; in the tunnel dt over the tunnel time.
        step: f64,
        /// Number of steps at most.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        steps: usize,
    } in Constants, "relative", by discrete_solution, compares (Steps | Itself);
    /// Central difference: worst relative distance of the time of step i from i dt, over `steps` steps.
    Clock {
        /// How many steps.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        steps: usize,
    } in Constants, "relative", by clock, compares (Steps | Itself);
    /// Central difference at rest in the crater, rest located: relative distance of error/(w dt)² from 1/8 (depth) or
    /// -1/24 (time).
    CraterConstant {} in Constants, "relative", by crater_constant, compares (Steps | Itself);
    /// Central difference at rest in the crater, step ends: how far (X(dt)/X - 1)/(w dt)² leaves 0 to 1/8, over many
    /// steps, and how far its extremes stay inside; relative to 1/8.
    CraterBand {} in Constants, "relative", by crater_band, compares (Steps | Itself);
    /// Lagged drag: relative distance of error/dt from the modified equation's constant.
    LaggedConstant {} in Constants, "relative", by lagged_constant, compares (Steps | Itself);
    /// Central difference of undamped crater motion: |w dt - 2|/2 at which growth sets in.
    StabilityLimit {} in Stability, "relative", by stability_limit, compares (Steps | Itself);
    /// Central difference: worst relative distance of the measured boundary of stability in w dt from the theoretical
    /// one over the drag group Q V dt/M, for every velocity rule.
    StabilityMap {
        /// How many drag groups, for each velocity rule.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        points: usize,
    } in Stability, "relative", by stability_map, compares (Steps | Itself);
    /// Central difference: rounding error of the depth with compensated sums over that with plain ones, after
    /// 2^`from` to 2^`to` steps; not a number unless truncation falls at second order.
    RoundingFloor {
        /// Power of two of the fewest steps.
        from: u32,
        /// Power of two of the most steps.
        to: u32,
    } in Stability, "compensated/plain", by rounding_floor, compares nothing;
}

/// Solution by the claim's velocity rule and `boundaries` at equal steps of `dt` (s).
fn at_step(subject: &Subject<'_>, boundaries: Boundaries, dt: f64) -> Found<Flight> {
    let scheme = CentralDifference::uniform(dt, subject.velocity(), boundaries);
    Ok(scheme.solve(subject.problem()?, Detail::Events)?)
}

/// First `steps` nodes of the claim's scheme at equal steps of `dt` (s), boundaries ignored.
fn free_states(subject: &Subject<'_>, problem: &Problem, dt: f64, steps: usize) -> Found<Vec<State>> {
    Ok(CentralDifference::uniform(dt, subject.velocity(), Boundaries::StepEnd).free_states(problem, steps)?)
}

/// Mean of `of` over `places`.
fn mean(places: [f64; 6], of: impl Fn(f64) -> Found<f64>) -> Found<f64> {
    let sum = places.into_iter().try_fold(0.0, |sum, place| Ok::<_, NotMeasured>(sum + of(place)?))?;
    Ok(sum / places.len() as f64)
}

/// The exact solution of a motion that comes to rest in the crater, and the frequency w (1/s) there.
fn rest_in_crater(subject: &Subject<'_>) -> Found<(Flight, f64)> {
    let problem = subject.problem()?;
    let exact = subject.truth()?.flight;
    let rests = problem.crater == Some(0) && exact.stage == 0 && exact.outcome != Outcome::Perforated;
    applies!(rests, "the projectile does not come to rest in the crater");
    Ok((exact, (problem.stages[0].stiffness / problem.mass).sqrt()))
}

/// The exact discrete solution:
///
/// ```text
/// crater:        x(i) = V0 dt sin(i th)/sin(th),  2 sin(th/2) = w dt
/// tunnel, Q = 0: x(i) = V0 i dt - P (i dt)²/(2 M)
/// ```
///
/// No velocity rule enters. `step` is w dt in the crater, dt over the time to rest in the tunnel.
fn discrete_solution(&DiscreteSolution { step, steps }: &DiscreteSolution, subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let Stage { static_force, stiffness, viscosity, drag, .. } = problem.stages[0];
    let is_free_of_velocity = viscosity == 0.0 && drag == 0.0;
    applies!(is_free_of_velocity, "the exact discrete solution has no velocity in the force");
    let v0 = problem.impact_speed;
    let is_crater = static_force == 0.0 && stiffness > 0.0;
    let is_constant = stiffness == 0.0 && static_force > 0.0;
    applies!(is_crater || is_constant, "neither a crater nor a constant force comes first");
    let deceleration = static_force / problem.mass;
    let dt = if is_crater { step / (stiffness / problem.mass).sqrt() } else { step * v0 / deceleration };
    let angle = 2.0 * (0.5 * step).asin();
    // Within round-off of the limit the amplitude grows without bound; it is the scale of the error.
    let amplitude = if is_crater { v0 * dt / angle.sin() } else { 0.5 * v0 * v0 / deceleration };
    let exact = |i: usize| {
        let t = i as f64 * dt;
        if is_crater { amplitude * (i as f64 * angle).sin() } else { t * (v0 - 0.5 * deceleration * t) }
    };
    let states = free_states(subject, problem, dt, steps)?;
    // The parabola turns back. The largest distance reached is the scale where it is larger.
    let scale = states.iter().map(|s| s.depth.abs()).fold(amplitude.abs(), f64::max);
    let worst = worst_of(states.iter().enumerate().map(|(i, s)| (s.depth - exact(i)).abs() / scale));
    Ok(Measurement::new(worst).remark(format!("{} steps of {dt:.3e} s", states.len())))
}

/// The step is a thousandth of the duration over an odd number, with a full significand: a running sum of it is off by
/// the square of the number of steps.
fn clock(&Clock { steps }: &Clock, subject: &Subject<'_>) -> Found {
    let dt = subject.truth()?.flight.end.time / 1003.0;
    let states = free_states(subject, subject.problem()?, dt, steps)?;
    let errors = states.iter().enumerate().skip(1).map(|(i, s)| off(s.time, i as f64 * dt));
    Ok(Measurement::new(worst_of(errors)).remark(format!("{steps} steps of {dt:.3e} s")))
}

/// At rest in the crater `X(dt)/X - 1 -> (w dt)²/8` and `T(dt)/T - 1 -> -(w dt)²/24`, rest located.
fn crater_constant(subject: &Subject<'_>) -> Found {
    let (exact, w) = rest_in_crater(subject)?;
    let is_located = subject.boundaries() != Boundaries::StepEnd;
    applies!(is_located, "step ends leave a depth error anywhere between 0 and (w dt)²/8");
    // Richardson over two steps removes the next even power; what remains is (w dt)^4.
    let ratio = |w_dt: f64| -> Found<f64> {
        let flight = at_step(subject, subject.boundaries(), w_dt / w)?;
        Ok(match subject.quantity()? {
            Quantity::Depth => (flight.end.depth / exact.end.depth - 1.0) / (w_dt * w_dt) * 8.0,
            Quantity::Time => (flight.end.time / exact.end.time - 1.0) / (w_dt * w_dt) * -24.0,
            other => return Err(NotMeasured::skip(format!("no constant is known for {}", other.name()))),
        })
    };
    // Rest falls at its own place in each step; the mean over several steps is what has the limit.
    let mean = mean([0.010_3, 0.009_1, 0.008_7, 0.007_9, 0.007_1, 0.006_7], ratio)?;
    Ok(Measurement::new((mean - 1.0).abs()).remark(format!("measured/predicted {mean:.6}")))
}

/// At rest in the crater, seen at step ends, `(X(dt)/X - 1)/(w dt)²` lies between 0 and 1/8 and comes near to both.
///
/// The deepest node is at most half a step from the deepest place of the discrete path, which is `(w dt)²/8` too deep.
fn crater_band(subject: &Subject<'_>) -> Found {
    const STEPS: usize = 200;
    let (exact, w) = rest_in_crater(subject)?;
    let mut random = subject.random("crater band");
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for _ in 0..STEPS {
        let w_dt = random.log_uniform(1e-3, 1e-2);
        let flight = at_step(subject, Boundaries::StepEnd, w_dt / w)?;
        let share = (flight.end.depth / exact.end.depth - 1.0) / (w_dt * w_dt) * 8.0;
        holds!(!share.is_nan(), "no depth at w dt = {w_dt}");
        (least, most) = (least.min(share), most.max(share));
    }
    Ok(Measurement::new(least.abs().max((most - 1.0).abs()))
        .remark(format!("depth error from {least:.4} to {most:.4} of (w dt)²/8 over {STEPS} steps")))
}

/// The lagged drag's error over dt against the modified equation `M V' = -F (1 + Q V dt/M)`:
///
/// ```text
/// D = (V1 - V) - P (t - t1)/M,  the velocity lost to drag in the tunnel
/// rest: X -> -D,  T -> -Q (X - k d)/M;      exit: V_r -> -(P + Q V_r²) D/(M V_r),  t -> D/V_r - Q (H - k d)/M
/// ```
fn lagged_constant(subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let (quantity, boundaries) = (subject.named_quantity(), subject.boundaries());
    applies!(subject.velocity() == VelocityAt::LaggedHalfStep, "only a lagged drag has this constant");
    let exact = subject.truth()?.flight;
    let is_plain = subject.scene()?.concrete().is_some_and(|concrete| concrete.layers.is_empty());
    let ends_in = |stage: &&Stage| is_plain && exact.stage + 1 == problem.stages.len() && stage.drag > 0.0;
    let tunnel = problem.stages.last().filter(ends_in);
    let tunnel = tunnel.ok_or_else(|| NotMeasured::skip("the motion does not end in a tunnel with drag"))?;
    let continuous = problem.crater.is_none_or(|i| {
        let at = exact.crater_end().unwrap_or(exact.end);
        let (left, right) = (problem.stages[i].force(at.depth, at.velocity), tunnel.force(at.depth, at.velocity));
        (left - right).abs() <= 1e-9 * right.abs()
    });
    let has_limit = continuous || boundaries == Boundaries::Landed;
    applies!(has_limit, "after a jump that is not landed on, error/dt has no limit");
    let (p, q, mass) = (tunnel.static_force, tunnel.drag, problem.mass);
    let entry = exact.crater_end().unwrap_or(State { time: 0.0, depth: 0.0, velocity: problem.impact_speed });
    let end = exact.end;
    let lost = (entry.velocity - end.velocity) - p * (end.time - entry.time) / mass;
    let perforated = !exact.outcome.is_stop();
    let predicted = match (quantity, perforated) {
        (Some(Quantity::Depth), false) => -lost,
        (Some(Quantity::Time), false) => -q * (end.depth - entry.depth) / mass,
        (Some(Quantity::Velocity), true) => -(p + q * end.velocity * end.velocity) * lost / (mass * end.velocity),
        (Some(Quantity::Time), true) => lost / end.velocity - q * (end.depth - entry.depth) / mass,
        _ => return Err(NotMeasured::skip("the scene fixes this quantity, or no constant is known for it")),
    };
    let has_limit = boundaries != Boundaries::StepEnd || quantity == Some(Quantity::Depth);
    applies!(has_limit, "with step ends only the depth has a limit of error/dt");
    // error(dt)/dt = C + C' dt: extrapolated from a step and twice the step, averaged over steps without common ratio.
    let error = |steps: f64| -> Found<f64> {
        let dt = end.time / steps;
        let flight = at_step(subject, boundaries, dt)?;
        holds!(flight.outcome.agrees_with(exact.outcome), "the scheme has another outcome at this step");
        let difference = match quantity {
            Some(Quantity::Depth) => flight.end.depth - end.depth,
            Some(Quantity::Time) => flight.end.time - end.time,
            _ => flight.end.velocity - end.velocity,
        };
        Ok(difference / dt)
    };
    let steps = [20_011.3, 23_003.7, 27_017.1, 31_019.9, 36_007.3, 41_011.7];
    let measured = mean(steps, |count| Ok(2.0 * error(count)? - error(0.5 * count)?))?;
    Ok(Measurement::new(off(measured, predicted)).remark(format!("error/dt {measured:.6e}, predicted {predicted:.6e}")))
}

/// By bisection on the growth of the free crater motion over many steps.
fn stability_limit(subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let crater = problem.stages[0];
    applies!(crater.stiffness > 0.0, "a stage without stiffness has no step limit");
    let free = Problem { exit_depth: f64::INFINITY, ..problem.clone() };
    let w = (crater.stiffness / free.mass).sqrt();
    let grows = |w_dt: f64| -> Found<bool> {
        let states = free_states(subject, &free, w_dt / w, 4000)?;
        let reach = |part: &[State]| worst_of(part.iter().map(|s| s.depth.abs()));
        let (early, late) = states.split_at(states.len() / 2);
        // Bounded below the limit: the later half reaches no farther, but for the grid of its sampling. Linear growth
        // at the limit doubles the reach.
        let ratio = reach(late) / reach(early);
        Ok(ratio.is_nan() || ratio > 1.5)
    };
    let (stable, unstable) = (1.0, 3.0);
    holds!(!grows(stable)? && grows(unstable)?, "no limit between w dt = 1 and 3");
    let limit = try_bisect(stable, unstable, 40, |w_dt| grows(w_dt).map(|grows| !grows))?;
    // What the crate states, for a crater without drag.
    let stated = w * stability_limit_of(&crater, free.mass, free.impact_speed, subject.velocity());
    let error = worst_of([limit, stated].map(|limit| (limit - 2.0).abs() / 2.0));
    Ok(Measurement::new(error).remark(format!("growth sets in at w dt = {limit:.9}")))
}

fn stability_map(&StabilityMap { points }: &StabilityMap, _: &Subject<'_>) -> Found {
    let boundary = stability::map(points)?;
    let worst = worst_of(boundary.iter().map(|p| off(p.measured, p.theory)));
    Ok(Measurement::new(worst)
        .remark(format!("{} points of the boundary", boundary.len()))
        .evidence(Evidence::Boundary(boundary)))
}

fn rounding_floor(&RoundingFloor { from, to }: &RoundingFloor, subject: &Subject<'_>) -> Found {
    rounding_of(subject.problem()?, from, to)
}

/// The rounding that compensated sums leave, over that of plain ones, centred and landed; NaN unless truncation falls at
/// second order. Beyond 2^`to` steps only the error is followed, up to where rounding outweighs it.
pub(super) fn rounding_of(problem: &Problem, from: u32, to: u32) -> Found {
    /// Steps at which the truncation of second order has sunk to the rounding of f64.
    const FLOOR: u32 = 21;
    let all = rounding::floor(problem, from, to, to.max(FLOOR))?;
    let errors =
        |row: &rounding::Floor| Some((row.steps, [row.truncation?, row.plain.rounding?, row.compensated.rounding?]));
    let rows: Vec<_> = all.iter().filter_map(errors).collect();
    let (steps, [_, plain, compensated]) = rows.last().ok_or_else(|| NotMeasured::broken("no row"))?;
    let slope = |index: usize| rounding::slope(rows.iter().map(|(steps, errors)| (*steps, errors[index])));
    let slopes = [0, 1, 2].map(slope);
    let [truncation, ..] = slopes;
    let remark = format!(
        "slopes over the steps: truncation {truncation:.2}, plain rounding {:.2}, compensated {:.2}; at {steps} steps {plain:.1e} and {compensated:.1e}",
        slopes[1], slopes[2],
    );
    // The largest over the last rows: a single one may hit the exact value.
    let tail = |index: usize| rows.iter().rev().take(4).map(|(_, errors)| errors[index]).fold(0.0, f64::max);
    let gain = tail(2) / tail(1);
    let value = if (truncation + 2.0).abs() < 0.05 { gain } else { f64::NAN };
    Ok(Measurement::new(value).remark(remark).evidence(Evidence::Rounding(all)))
}
