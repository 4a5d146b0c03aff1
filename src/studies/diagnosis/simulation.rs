//! What would a solver with a given fault answer? The flight under any force, and on beyond its end.
//!
//! The law of a stage may be any smooth function of x and V here, such as a spring that pushes, or a drag with another
//! power: the proofs behind [`Taylor`] do not hold for those, and a number that is only compared needs none. The
//! integrator is Gragg's midpoint rule, extrapolated; an event is found by Newton's method on the step that passes it.
//!
//! Source: Hairer, Nørsett, Wanner (1993), Solving Ordinary Differential Equations I, section II.9.

use std::cell::Cell;

use crate::integrators::{Detail, Integrator, Taylor};
use crate::physics::{Problem, Stage, State};

/// Columns of the extrapolation: order 16.
const COLUMNS: usize = 8;
/// Error allowed in a step, relative to the greatest speed and the distance of the step: of the last column but one, and the
/// last is far better.
const TOLERANCE: f64 = 1e-12;
/// Difference of two columns, relatively, behind which more of them change nothing.
const ROUNDING: f64 = f64::EPSILON / 4.0;
/// Steps of a flight at most, those taken again included.
const STEPS_MAX: usize = 500;
/// Longest step, times the rate of the fastest motion.
const PHASE_MAX: f64 = 2.0;
/// Iterations for an event at most.
const ITERATIONS_MAX: usize = 100;

/// Where a force is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Which stage.
    pub index: usize,
    /// Law of the stage.
    pub law: &'a Stage,
    /// Depth (m).
    pub depth: f64,
    /// Velocity (m/s).
    pub velocity: f64,
    /// Velocity at the start of the stage (m/s).
    pub entry_speed: f64,
    /// Impact speed (m/s).
    pub impact_speed: f64,
    /// Mass (kg).
    pub mass: f64,
}

/// A force (N) at a place, by a law with one number in it.
pub(super) type Force = fn(&Place<'_>, f64) -> f64;

/// The force of the equation of motion.
pub(super) fn right_force(place: &Place<'_>, _: f64) -> f64 {
    place.law.force(place.depth, place.velocity)
}

/// A stage that a flight has passed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Which stage.
    pub index: usize,
    /// The state at its start.
    pub start: State,
}

/// What changes at the end of a stage, by one number.
pub(super) type AtStageEnd = fn(&Passage<'_>, &mut State, f64);

/// How a simulated flight differs from the right one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// The force, and its number.
    pub force: (Force, f64),
    /// What changes behind each end of a stage, and its number.
    pub at_stage_end: Option<(AtStageEnd, f64)>,
    /// It rests once V is at most this (m/s).
    pub rest_speed: f64,
    /// The same in parts of V at the start of the stage.
    pub rest_part: f64,
    /// It ends at this time (s), wherever it is.
    pub end_time: f64,
    /// It ends so long (s) after the start of a stage.
    pub stage_time: f64,
}

impl Default for Rules {
    fn default() -> Self {
        let never = f64::INFINITY;
        Self {
            force: (right_force, 1.0),
            at_stage_end: None,
            rest_speed: 0.0,
            rest_part: 0.0,
            end_time: never,
            stage_time: never,
        }
    }
}

/// Where a simulated flight ends, and what it passed before.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Simulated {
    /// The end.
    pub end: State,
    /// Stage in which it ends.
    pub stage: usize,
    /// States at the ends of the stages passed, by stage.
    pub passed: Vec<(usize, State)>,
}

/// x and V after a time `h`, and the estimated errors of both, under the deceleration `a`.
fn extrapolated(a: &impl Fn(f64, f64) -> f64, x: f64, v: f64, h: f64) -> ([f64; 2], [f64; 2]) {
    let mut row = [[0.0; 2]; COLUMNS];
    let (mut best, mut error) = ([x, v], [f64::INFINITY; 2]);
    let first = a(x, v);
    let start = |part: f64| ([x, v], [x + part * v, v - part * first]);
    let step = |part: f64, (before, now): ([f64; 2], [f64; 2])| {
        (now, [before[0] + 2.0 * part * now[1], before[1] - 2.0 * part * a(now[0], now[1])])
    };
    for pair in (0..COLUMNS).step_by(2) {
        // Two columns side by side: neither waits for the steps of the other.
        let counts = [2 * (pair + 1), 2 * (pair + 2)];
        let parts = counts.map(|steps| h / steps as f64);
        let mut ends = parts.map(start);
        for _ in 1..counts[0] {
            ends = [step(parts[0], ends[0]), step(parts[1], ends[1])];
        }
        for _ in counts[0]..counts[1] {
            ends[1] = step(parts[1], ends[1]);
        }
        for (column, (part, (before, now))) in (pair..).zip(parts.into_iter().zip(ends)) {
            // Neville's scheme in h²: row k of the last column gives way to that of this one.
            let mut finer =
                [0.5 * (before[0] + now[0] + part * now[1]), 0.5 * (before[1] + now[1] - part * a(now[0], now[1]))];
            for (k, entry) in row.iter_mut().enumerate().take(column + 1) {
                let coarser = std::mem::replace(entry, finer);
                if k < column {
                    let ratio = (column + 1) as f64 / (column - k) as f64;
                    finer = std::array::from_fn(|i| finer[i] + (finer[i] - coarser[i]) / (ratio * ratio - 1.0));
                }
            }
            error = std::array::from_fn(|i| (finer[i] - best[i]).abs());
            best = finer;
            // A short step needs few columns.
            if column > 0 && error[0] <= ROUNDING * (h * v).abs() && error[1] <= ROUNDING * v.abs() {
                return (best, error);
            }
        }
    }
    (best, error)
}

/// The time in `0..=h` at which `g`, which gives a value and its slope, becomes positive, looked for from `guess` on: it is not
/// positive at 0, and is at `h`.
fn first_positive(h: f64, guess: f64, g: impl Fn(f64) -> [f64; 2]) -> f64 {
    let (mut low, mut high, mut now) = (0.0, h, guess);
    for _ in 0..ITERATIONS_MAX {
        let [value, slope] = g(now);
        if value.abs() <= f64::EPSILON * now * slope.abs() || high - low <= f64::EPSILON * high {
            break;
        }
        if value > 0.0 {
            high = now;
        } else {
            low = now;
        }
        let next = now - value / slope;
        now = if low < next && next < high { next } else { 0.5 * (low + high) };
    }
    now
}

/// The flight through `problem` by `rules`.
///
/// `None` where it does not end within some thousand steps, or leaves the range of numbers.
pub(super) fn simulate(problem: &Problem, rules: Rules) -> Option<Simulated> {
    let Rules { force: (force, number), at_stage_end, rest_speed, rest_part, end_time, stage_time } = rules;
    // Times of whoever changes them at ends of stages are not those of the flight.
    let mut elapsed = 0.0;
    let mut state = State::at_impact(problem);
    let mut passed = Vec::new();
    let mut taken = 0;
    let mut h = f64::INFINITY;
    let mut fastest = problem.impact_speed;
    for (index, law) in problem.stages.iter().enumerate() {
        let limit = problem.limit_of(index);
        let start = state;
        let (impact_speed, entry_speed, mass) = (problem.impact_speed, start.velocity, problem.mass);
        let end_time = end_time.min(elapsed + stage_time);
        let rest_speed = rest_speed.max(rest_part * entry_speed);
        while state.depth < limit {
            let State { time, depth: x, velocity: v } = state;
            // By the distance since x, not by the depth: a stage may be far shorter than it is deep.
            let a = |distance: f64, velocity| {
                let depth = x + distance;
                force(&Place { problem, index, law, depth, velocity, entry_speed, impact_speed, mass }, number) / mass
            };
            let left = limit - x;
            // Below a speed of rest, and driven, it moves on.
            let is_at_rest = v <= rest_speed && (v <= 0.0 || a(0.0, v) >= 0.0);
            if is_at_rest || elapsed >= end_time {
                return Some(Simulated { end: state, stage: index, passed });
            }
            // No step much longer than the distance to the limit, or than the loss of the speed.
            let crossing = 1.2 * left / v;
            let stopping = 1.2 * v / a(0.0, v).abs();
            // Nor than what the fastest motion of the stage takes, of which the error estimate would see nothing.
            let rate =
                (law.stiffness.abs() / problem.mass).sqrt() + (law.viscosity + 2.0 * law.drag * v).abs() / problem.mass;
            h = h.min(crossing).min(stopping).min(PHASE_MAX / rate).min(end_time - elapsed);
            if !h.is_finite() {
                h = 1.0 / v;
            }
            let ([distance, speed], error) = extrapolated(&a, 0.0, v, h);
            taken += 1;
            if taken > STEPS_MAX {
                return None;
            }
            fastest = fastest.max(speed);
            let off = (error[1] / fastest).max(error[0] / (h * fastest)) / TOLERANCE;
            if !(off <= 1.0) {
                h *= if off.is_finite() { (0.8 * off.powf(-1.0 / 15.0)).clamp(0.1, 0.7) } else { 0.1 };
                continue;
            }
            // From the nearest place that is known: Newton's method comes ever closer to the last one.
            let asked = Cell::new((0.0, [0.0, v]));
            let within = |part: f64| {
                let known = [(0.0, [0.0, v]), (h, [distance, speed]), asked.get()];
                let off = |(at, _): &(f64, [f64; 2])| (part - at).abs();
                let nearest = known.into_iter().min_by(|one, other| off(one).total_cmp(&off(other)));
                let (at, [distance, speed]) = nearest.unwrap_or(known[0]);
                let (place, _) = extrapolated(&a, distance, speed, part - at);
                asked.set((part, place));
                place
            };
            let rest = (speed <= rest_speed).then(|| {
                first_positive(h, h * (v - rest_speed) / (v - speed), |part| {
                    let [distance, speed] = within(part);
                    [rest_speed - speed, a(distance, speed)]
                })
            });
            let last = rest.unwrap_or(h);
            let farthest = rest.map_or(distance, |part| within(part)[0]);
            if farthest >= left {
                let part = first_positive(last, last * left / farthest, |part| {
                    let [distance, speed] = within(part);
                    [distance - left, speed]
                });
                elapsed += part;
                state = State { time: time + part, depth: limit, velocity: within(part)[1].max(rest_speed) };
                break;
            }
            if let Some(part) = rest {
                let end = State { time: time + part, depth: x + farthest, velocity: rest_speed };
                return Some(Simulated { end, stage: index, passed });
            }
            elapsed += h;
            state = State { time: time + h, depth: x + distance, velocity: speed };
            h *= (0.8 * off.max(1e-9).powf(-1.0 / 15.0)).clamp(1.0, 3.0);
        }
        if state.depth >= law.end {
            passed.push((index, state));
        }
        if state.depth >= problem.exit_depth {
            return Some(Simulated { end: state, stage: index, passed });
        }
        if let Some((alter, number)) = at_stage_end {
            alter(&Passage { problem, index, start }, &mut state, number);
        }
        h = f64::INFINITY;
    }
    None
}

/// The state a time `late` (s) after `state`, as the law of stage `index` goes on, also backwards.
pub(super) fn continued(problem: &Problem, index: usize, state: State, late: f64) -> Option<State> {
    let law = problem.stages.get(index)?;
    let a = |x, v| law.force(x, v) / problem.mass;
    let (mut now, parts) = ([state.depth, state.velocity], 4);
    for _ in 0..parts {
        (now, _) = extrapolated(&a, now[0], now[1], late / f64::from(parts));
    }
    let [depth, velocity] = now;
    let state = State { time: state.time + late, depth, velocity };
    state.is_finite().then_some(state)
}

/// The right flight through `problem`, which may have numbers that no scene has.
pub(super) fn solve(problem: &Problem) -> Option<Simulated> {
    let is_usual = |law: &Stage| law.stiffness >= 0.0 && law.viscosity >= 0.0 && law.drag >= 0.0;
    if !problem.stages.iter().all(is_usual) {
        return simulate(problem, Rules::default());
    }
    let flight = Taylor::default().solve(problem, Detail::Events).ok()?;
    let passed = flight.events.iter().filter_map(|event| match event.kind {
        crate::physics::EventKind::StageEnd(index) => Some((index, event.state)),
        crate::physics::EventKind::CraterEnd => Some((problem.crater?, event.state)),
        _ => None,
    });
    Some(Simulated { end: flight.end, stage: flight.stage, passed: passed.collect() })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a flight that does not end is a failed test")]
mod tests {
    use super::*;
    use crate::exchange::peers::wire::{conditioning, errors};
    use crate::studies::diagnosis::questions::{Content, questions};

    #[test]
    fn the_simulation_of_the_right_law_is_the_flight() {
        let mut wrong = Vec::new();
        for question in questions(3, 250, false).iter().filter(|question| question.problem.impact_speed > 0.0) {
            let (problem, right) = (&question.problem, solve(&question.problem).unwrap());
            // A stiff stage takes more steps than a simulation has.
            let Some(found) = simulate(problem, Rules::default()) else {
                assert!(question.contains.contains(&Content::Stiff), "{}", question.id);
                continue;
            };
            let errors = errors(found.end, right.end, problem.impact_speed);
            let conditions = conditioning(right.end, problem);
            let over = |i: usize| errors[i].abs() / conditions[i].max(question.conditions[i]);
            if !((0..3).all(|i| over(i) < 1e-11)) || found.passed.len() != right.passed.len() {
                wrong.push(format!("{}: {errors:?} {found:?} {right:?}", question.id));
            }
        }
        assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
    }

    #[test]
    fn a_flight_below_the_speed_of_rest_ends_unless_it_is_driven() {
        let rules = Rules { rest_speed: 0.1, ..Rules::default() };
        let end = |force| {
            let problem = Problem::of_stages(1.0, 0.05, [Stage::tunnel(force, 0.0)]).with_exit(1.0);
            simulate(&problem, rules).unwrap().end
        };
        assert_eq!(end(2.0), State { time: 0.0, depth: 0.0, velocity: 0.05 });
        let driven = end(-2.0);
        assert!((driven.velocity - 4.0025_f64.sqrt()).abs() < 1e-12 && driven.depth == 1.0, "{driven}");
    }

    #[test]
    fn a_flight_goes_on_after_its_rest_as_its_law_has_it() {
        let problem = Problem::of_stages(2.0, 30.0, [Stage::tunnel(1000.0, 0.0)]);
        let rest = solve(&problem).unwrap();
        // 500 m/s² for 10 ms more.
        let after = continued(&problem, rest.stage, rest.end, 0.01).unwrap();
        assert!((after.velocity + 5.0).abs() < 1e-12 && (after.depth - (0.9 - 0.025)).abs() < 1e-14, "{after}");
    }
}
