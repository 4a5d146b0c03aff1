//! The largest stable step of the scheme, and the step it takes by default.

use smallvec::SmallVec;

use super::VelocityAt;
use crate::physics::{Problem, Scalar, Stage, State};

/// Whole steps in the shortest time scale of the stages, for [`super::Steps::Default`].
const STEPS_PER_SHORTEST_SCALE: f64 = 1e3;

/// Most whole steps in the longest time scale of the stages, for [`super::Steps::Default`]: a crater of 1e-8 diameters
/// is not resolved by 1e11 steps.
const STEPS_PER_LONGEST_SCALE: f64 = 1e6;

/// Doublings of a distance from an epsilon of that of a second.
const DOUBLINGS: u32 = 200;

/// More stages than this are pieces of a table.
const TABLE_MIN: usize = 64;

/// Largest part of the stability limit that [`super::Steps::Default`] uses.
pub(super) const PART_OF_LIMIT: f64 = 0.25;

/// True if even 1000 × `time` (s) is too short to reach rest or the exit. Lets a hopeless step size fail at once
/// instead of after the full step budget (about 30 s with subnormal numbers).
///
/// While every stage only resists, `x <= V0 t` and `V >= V0 - t F_max/M`, `F_max` the largest force up to that depth at
/// V0: neither the exit is reached nor rest.
pub(super) fn cannot_end<S: Scalar>(problem: &Problem<S>, time: f64) -> bool {
    let (mass, speed, time) = (problem.mass.value(), problem.impact_speed.value(), 1e3 * time);
    let reach = speed * time;
    // A law of its own may do anything.
    if !problem.laws.is_empty() {
        return false;
    }
    let mut met =
        (0..problem.stages.len()).filter(|&i| problem.start_of(i).value() <= reach).map(|i| &problem.stages[i]);
    let keeps_moving = |law: &Stage<S>| {
        let force = law.force(S::from_f64(reach), problem.impact_speed).value();
        law.resists() && time * force < mass * speed
    };
    reach < problem.exit_depth.value() && met.all(keeps_moving)
}

/// The longest step (s) that an explicit finite-element code takes in `stage`, of mass `mass` (kg) at speed `speed` (m/s): the shorter of
/// `2/w` and `M/(r/2 + q V)`; `None` where neither exists.
pub fn automatic_step(stage: &Stage, mass: f64, speed: f64) -> Option<f64> {
    let by_spring = 2.0 * (mass / stage.stiffness).sqrt();
    let by_drag = mass / (0.5 * stage.viscosity + stage.drag * speed);
    let times = [by_spring, by_drag].into_iter().filter(|time| time.is_finite() && *time > 0.0);
    times.reduce(f64::min)
}

/// The default time step (s), from the coefficients of the stages and the impact speed alone.
///
/// A thousandth of the shortest time scale among the stages that start before the exit: `sqrt(M/|s|)` (half of 2/w),
/// `M/(q V0)`, `M/r`, `M V0/|p + s x|` at both ends, and the crossing time of the stage at V0. But not less than a
/// millionth of the longest time that V0 alone would let a stage last, and at most a quarter of the stability limit
/// at V0. A heuristic: it resolves the paper's scenes in 10³ to 10⁵ steps, and promises nothing about the error.
pub fn default_time_step<S: Scalar>(problem: &Problem<S>, velocity: VelocityAt) -> f64 {
    let (mass, speed) = (problem.mass.value(), problem.impact_speed.value());
    let least = |times: &[f64]| times.iter().copied().filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
    let (mut shortest, mut limit, mut longest) = (f64::INFINITY, f64::INFINITY, 0.0_f64);
    // Of a table, whose pieces follow no scale of the motion, none counts as shorter than they are in the mean.
    let count = problem.stages.len();
    let finest = if count > TABLE_MIN { problem.start_of(count - 1).value() / count as f64 } else { 0.0 };
    for index in 0..count {
        let (start, to) = (problem.start_of(index).value(), problem.limit_of(index).value());
        if to <= start {
            continue;
        }
        let crossing = (to - start).max(finest) / speed;
        for place in places(problem, index) {
            let at = State { time: S::zero(), depth: S::from_f64(place.depth), velocity: S::from_f64(place.velocity) };
            let stage = &problem.linear(index, at);
            let Stage { static_force: p, stiffness: s, viscosity: r, drag: q, .. } = stage.values();
            let from = place.depth;
            let swing = (mass / s.abs()).sqrt();
            // A spring cannot be compressed further than V0/w beyond the start of its stage.
            let farthest = to.min(from + speed * swing);
            let weakening = match s {
                s if s > 0.0 => (p + s * farthest).abs(),
                // A drive grows up to the end.
                s if s < 0.0 => (p + s * to).abs(),
                _ => 0.0,
            };
            let stopping = mass * speed / (p + s * from).abs().max(weakening);
            shortest = shortest.min(least(&[crossing, swing, stopping, mass / r, mass / (q * speed)]));
            let slowest = least(&[crossing, swing, mass * speed / p.abs(), mass / (p.abs() * q).sqrt()]);
            if slowest.is_finite() {
                longest = longest.max(slowest);
            }
            limit = limit.min(stability_limit(stage, mass, speed, velocity));
        }
    }
    let step = (shortest / STEPS_PER_SHORTEST_SCALE).max(longest / STEPS_PER_LONGEST_SCALE).min(PART_OF_LIMIT * limit);
    // A target that does nothing has no scale at all; any step then gives the same flight. Nor may the choice
    // underflow or overflow, whatever the scene.
    if step.is_finite() { step.max(f64::MIN_POSITIVE) } else { 1.0 }
}

/// Where the time scales of a stage are asked: at its start; of a law of its own also at eight more places before rest,
/// as far as the force at V0 lets it come.
fn places<S: Scalar>(problem: &Problem<S>, index: usize) -> SmallVec<[State; 9]> {
    let speed = problem.impact_speed.value();
    let (start, to) = (problem.start_of(index).value(), problem.limit_of(index).value());
    let at = |distance: f64, velocity: f64| State { time: 0.0, depth: start + distance, velocity };
    let mut places = SmallVec::from_elem(at(0.0, speed), 1);
    let Some(law) = problem.laws.of(index) else { return places };
    let energy = 0.5 * problem.mass.value() * speed * speed;
    let (mut distance, mut work) = (speed * f64::EPSILON, 0.0);
    for _ in 0..DOUBLINGS {
        let force = law.force_value(start + distance, speed);
        work += force.max(0.0) * 0.5 * distance;
        if work >= energy || start + distance >= to {
            let part = distance.min(to - start);
            let share = |i: u32| f64::from(i) / 8.0;
            places.extend((1..=8).map(|i| at(share(i) * part, speed * (1.0 - share(i)).sqrt())));
            break;
        }
        distance *= 2.0;
    }
    places
}

/// The largest stable step (s) in `stage` at speed `speed` (m/s); infinite where there is none.
///
/// With `w² = s/M` and `g = (r + 2 q V)/M`, the rate of the linearised drag, the two roots of the scheme's
/// characteristic polynomial stay within the unit circle for
///
/// ```text
/// lagged:     (w dt)² + 2 g dt < 4                      dt < 2/w without drag, dt < 2/g without stiffness
/// centred:    w dt < 2                                  whatever the drag
/// predicted:  (w dt)² (1 - b) < 4 (1 - b + b²), b < 1   b = g dt/2
/// ```
///
/// There is none where `s < 0`, without drag: the roots are positive then, and one grows as the motion itself does.
///
/// The limit itself is excluded: at `w dt = 2` amplitudes grow linearly. Between half of the limit and the limit the
/// lagged drag alternates about the solution instead of approaching it from one side.
///
/// # Source
/// `docs/theory.md`, section 5, for each term alone; the combined forms by the criterion of Schur and Cohn.
pub fn stability_limit<S: Scalar>(stage: &Stage<S>, mass: f64, speed: f64, velocity: VelocityAt) -> f64 {
    if stage.stiffness.value() < 0.0 {
        return f64::INFINITY;
    }
    let w_squared = stage.stiffness.value() / mass;
    let w = w_squared.sqrt();
    let g = (stage.viscosity.value() + 2.0 * stage.drag.value() * speed) / mass;
    match velocity {
        VelocityAt::LaggedHalfStep => 4.0 / (g + g.hypot(2.0 * w)),
        VelocityAt::Centred => 2.0 / w,
        VelocityAt::PredictedHalfStep => {
            // dt = (2/w) sqrt((1 - b + b²)/(1 - b)) as a fixed point: the right side grows with dt, so the iteration
            // climbs from 2/w to the first root, or past b = 1 when there is none.
            let mut limit = 2.0 / w;
            for _ in 0..200 {
                let b = 0.5 * g * limit;
                if b.is_nan() || b >= 1.0 {
                    return 2.0 / g;
                }
                let next = 2.0 / w * ((1.0 - b + b * b) / (1.0 - b)).sqrt();
                if next <= limit {
                    break;
                }
                limit = next;
            }
            limit
        }
    }
}
