//! What does a scheme of fixed steps make of one step? An exit within the first step shows it, where the step is shortened
//! to land there: the answer is the step `h`, the velocity behind it and, as the exit depth, its distance.
//!
//! Under `V' = -r V` every explicit scheme of one step gives `V1 = V0 (1 + c1 z + c2 z² + ...)`, `z = -r h`, with
//! `ck = 1/k!` up to its order. The coefficients follow from a few steps, and a scheme of Runge and Kutta with one number
//! changed is known by them. Under a constant deceleration `a`, `V1 = V0 - a h` and `x1 = V0 h - a h²/2`, in the first step
//! as in that behind the end of a stage.
//!
//! Source: Hairer, Nørsett, Wanner (1993), Solving Ordinary Differential Equations I, section II.1.

use nalgebra::{SMatrix, SVector};

use super::super::causes::{Cause, Certainty};
use super::super::{Asking, TOLERANCES, end_of};
use super::several_steps::{BEHIND, state_at};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage, State};

/// Steps asked for, each beyond the exit: the answer must not depend on it.
const STEPS: [f64; 2] = [0.8, 1.1];
/// Sizes `-z` of the steps from which the coefficients follow.
pub(super) const SIZES: [f64; COEFFICIENTS] = [0.015, 0.03, 0.05, 0.075, 0.1, 0.125];
pub(super) const COEFFICIENTS: usize = 6;
/// Size of the step that they must foretell.
pub(super) const FORETOLD: f64 = 0.06;
/// Relative difference of two ends that are the same.
const LANDED: f64 = 1e-12;
/// Difference of coefficients that are the same.
pub(super) const SAME: f64 = 1e-6;
/// Part of a coefficient by which it is another one, and the same of the fourth, which of a scheme that is no polynomial is off by 3e-3.
pub(super) const ANOTHER: f64 = 1e-3;
const ANOTHER_FOURTH: f64 = 0.02;
/// Step (s) of a scheme that does not land.
const NOT_LANDED: f64 = 0.1;
/// Highest order whose coefficient is compared.
const ORDER_MAX: usize = 4;

/// What one step shows of a scheme that should have the order `claimed`.
pub(super) fn measured(asking: &mut Asking<'_>, claimed: f64) -> Option<Cause> {
    let asked = STEPS.len() * SIZES.len();
    let certain = |id: &str, factor, statement| {
        Some(Cause { factor, ..Cause::plain(id, statement, Certainty::Certain, asked, asked) })
    };
    let Some(first) = constant_force(asking, 0.0, 0.0, landed) else {
        if let Some(part) = kick_of_step_asked(asking) {
            let statement = format!(
                "where a step under a constant deceleration a is shortened to land on an end, V is {part:.6} a smaller for each second \
                 of the step asked for: part of its force acts for as long as a whole step"
            );
            return certain("scheme-coefficient", Some(part), statement);
        }
        let kick = start_kick(asking);
        if kick.is_some() {
            return kick;
        }
        // A first step that is wrong is so behind stages too.
        let is_right = constant_force(asking, 0.0, 0.0, not_landed)?.first_wrong(claimed).is_none();
        return if is_right { behind_stage_end(asking, claimed) } else { None };
    };
    if lands_straight(asking) {
        let statement = "the step that lands on an end lasts the distance to it over V at the start of the step: the time and V there \
                         have an order that the steps do not have";
        return certain("event-straight", None, statement.to_owned());
    }
    let coefficients = coefficients(asking);
    let tableau =
        || coefficients.as_ref().and_then(changed_number).map_or_else(String::new, |said| format!(": {said}"));
    if let Some((what, [found, right])) = first.first_wrong(claimed) {
        let half = if first.is_half() { ", as of a velocity of half a step" } else { "" };
        let statement = format!(
            "the first step under a constant deceleration a has {what} with a factor {found:.6}, where order {} has \
             {right}{half}{}",
            if right < 1.0 { 2 } else { 1 },
            tableau()
        );
        return certain("scheme-coefficient", Some(found / right), statement);
    }
    if let Some(cause) = behind_stage_end(asking, claimed) {
        return Some(cause);
    }
    // A scheme of Runge and Kutta that takes x rightly takes V so too: one that does not has another V in its force.
    let order = (claimed.round() as usize).min(ORDER_MAX);
    let mut right = 1.0;
    for (index, found) in coefficients.as_ref()?.iter().enumerate().take(order) {
        right /= (index + 1) as f64;
        // Known to no more digits; adding zero makes 0 of -0.
        let found = (1e9 * found).round() / 1e9 + 0.0;
        let another = if index == 3 { ANOTHER_FOURTH } else { ANOTHER };
        if (found - right).abs() > another * right {
            let tableau = tableau();
            // Without the term the force is that of V at the start; with a part of it weights may be wrong too.
            let may_lag = tableau.is_empty() && index == 1 && found < right;
            let (id, certainty, lagged) = match may_lag {
                true if found.abs() <= SAME => {
                    ("drag-lagged", Certainty::Certain, ": the V in the force is that of the start of the step")
                }
                true => (
                    "drag-lagged",
                    Certainty::Likely,
                    ": the V in the force is that of another time, or a weight is wrong",
                ),
                false => ("scheme-coefficient", Certainty::Certain, ""),
            };
            let statement = format!(
                "the first step under V' = z V/h gives V the term {found:.6} z^{power}, where order {power} has {right:.6} \
                 z^{power}{lagged}{tableau}",
                power = index + 1
            );
            let factor = Some(found / right).filter(|_| !may_lag);
            return Some(Cause { factor, ..Cause::plain(id, statement, certainty, asked, asked) });
        }
    }
    None
}

/// What the step behind the end of a stage shows.
fn behind_stage_end(asking: &mut Asking<'_>, claimed: f64) -> Option<Cause> {
    let asked = STEPS.len() * SIZES.len();
    let certain = |id: &str, statement| Some(Cause::plain(id, statement, Certainty::Certain, asked, asked));
    let mut by = |ended: Ended| {
        Some((ended, constant_force(asking, 0.1, 0.0, ended)?, constant_force(asking, 0.25, 0.0, ended)?))
    };
    let (ended, near, far) = by(landed).or_else(|| by(not_landed))?;
    if let Some((what, [found, right])) = near.first_wrong(claimed) {
        let passed = if found.abs() <= SAME { passed_end(asking) } else { None };
        if passed == Some(Passed::Right) {
            let statement =
                "the end of a stage is missed in the step that reaches the exit: that step has the force before it";
            return certain("stage-end-missed", statement.to_owned());
        }
        return if near.is_same_as(&far) && passed != Some(Passed::Whole) {
            let statement =
                format!("the first step behind the end of a stage has {what} with a factor {found:.6}, not {right}");
            // Where the force is the same on both sides, part of the one before does no harm.
            let is_stale =
                constant_force(asking, 0.1, DECELERATION, ended).is_none_or(|same| same.first_wrong(claimed).is_none());
            if is_stale {
                certain("force-stale", statement + ": part of its force is that of the stage before")
            } else {
                certain(
                    "start-kick",
                    statement + ", whatever the force before: it is not started as the first step of all is",
                )
            }
        } else {
            let statement = "steps do not land on the ends of stages: where the force jumps the order falls to 1";
            certain("stage-end-late", statement.to_owned())
        };
    }
    if let Some((part, is_of_before)) = kick_behind(asking) {
        // One that starts every stage so does it at impact too.
        let at_impact = start_kick(asking);
        if at_impact.is_some() {
            return at_impact;
        }
        let reason = if is_of_before {
            "where the force there is another one: a slope of the stage before is kept"
        } else {
            "whatever the force before: it is not started as the first step of all is"
        };
        let statement = format!("behind the end of a stage V is {part:.6} a h off, whatever the step h, {reason}");
        return certain(if is_of_before { "force-stale" } else { "start-kick" }, statement);
    }
    None
}

/// How the end of a stage is passed where the exit lies a step behind it.
#[derive(PartialEq)]
enum Passed {
    /// By a step that is taken whole under the force before; the next one has the new force.
    Whole,
    /// Rightly.
    Right,
}

fn passed_end(asking: &mut Asking<'_>) -> Option<Passed> {
    const END: f64 = 0.1;
    const STEP: f64 = 0.3;
    const EXIT: f64 = 0.38;
    let stages = [Stage::free().until(END), Stage::tunnel(DECELERATION, 0.0)];
    let problem = Problem::of_stages(1.0, 1.0, stages).with_exit(EXIT);
    let request = PeerRequest { dt_s: Some(STEP), ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
    let lost = (1.0 - asking.ask(&request).ok()?.velocity_m_s) / DECELERATION;
    let is_over = |way: f64| (lost - way).abs() <= 0.1 * way;
    if is_over(EXIT - STEP) { Some(Passed::Whole) } else { is_over(EXIT - END).then_some(Passed::Right) }
}

/// By how much V falls with the step asked for, over the deceleration, where time and depth do not depend on it.
fn kick_of_step_asked(asking: &mut Asking<'_>) -> Option<f64> {
    let problem = Problem::of_stages(1.0, 1.0, [Stage::tunnel(DECELERATION, 0.0)]).with_exit(0.4);
    let mut end = |step: f64| {
        let request = PeerRequest { dt_s: Some(step), ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
        Some(end_of(&asking.ask(&request).ok()?).state).filter(|end| end.velocity > 0.0 && end.time < step)
    };
    let [first, middle, last] = [STEPS[0], 0.5 * (STEPS[0] + STEPS[1]), STEPS[1]].map(&mut end);
    let (first, middle, last) = (first?, middle?, last?);
    let is_same = |a: f64, b: f64| (a - b).abs() <= LANDED * a.abs();
    let is_one_place =
        [middle, last].iter().all(|end| is_same(end.time, first.time) && is_same(end.depth, first.depth));
    let is_even = is_same(first.velocity - middle.velocity, middle.velocity - last.velocity);
    let part = (first.velocity - last.velocity) / (DECELERATION * (STEPS[1] - STEPS[0]));
    (is_one_place && is_even && part.abs() > ANOTHER).then_some(part)
}

/// The end of a flight within one step, which is the same whatever the step asked for.
pub(super) fn landed(asking: &mut Asking<'_>, problem: &Problem, _: f64) -> Option<State> {
    let is_same = |a: f64, b: f64| (a - b).abs() <= LANDED * a.abs();
    let ends = STEPS.map(|step| {
        let request = PeerRequest { dt_s: Some(step), ..PeerRequest::from_problem(problem, TOLERANCES[0]) };
        let end = end_of(&asking.ask(&request).ok()?).state;
        let is_one_step = end.time > 0.0 && end.time < step && is_same(end.depth, problem.exit_depth);
        is_one_step.then_some(end)
    });
    let [Some(one), Some(other)] = ends else { return None };
    (is_same(one.time, other.time) && is_same(one.velocity, other.velocity)).then_some(one)
}

/// What a step under a constant deceleration makes of `a h` in V and of `a h²` in x.
struct Constant {
    velocity: f64,
    depth: f64,
}

impl Constant {
    fn is_half(&self) -> bool {
        (self.velocity - 0.5).abs() <= SAME && (self.depth - 0.5).abs() <= SAME
    }

    fn is_same_as(&self, other: &Self) -> bool {
        (self.velocity - other.velocity).abs() <= SAME && (self.depth - other.depth).abs() <= SAME
    }

    /// The first factor that a scheme of this order cannot have: what it belongs to, and beside the right one.
    fn first_wrong(&self, claimed: f64) -> Option<(&'static str, [f64; 2])> {
        let is_wrong = |found: f64, right: f64| (found - right).abs() > SAME;
        match () {
            () if is_wrong(self.velocity, 1.0) => Some(("a h in V", [self.velocity, 1.0])),
            () if claimed > 1.0 && is_wrong(self.depth, 0.5) => Some(("a h² in x", [self.depth, 0.5])),
            () => None,
        }
    }
}

/// The deceleration (m/s²) of flights with V0 = 1 m/s and M = 1 kg.
const DECELERATION: f64 = 0.5;

/// How the end of a first step is found: where a flight ends in it, or by the times of exits behind it.
type Ended = fn(&mut Asking<'_>, &Problem, f64) -> Option<State>;

/// The step at impact, or the one behind a first stage with the deceleration `of_first` that ends at `before` (m).
fn constant_force(asking: &mut Asking<'_>, before: f64, of_first: f64, ended: Ended) -> Option<Constant> {
    let braked = Stage::tunnel(DECELERATION, 0.0);
    let first = Stage::tunnel(of_first, 0.0).until(before);
    let stages = if before > 0.0 { vec![first, braked] } else { vec![braked] };
    let speed = (1.0 - 2.0 * of_first * before).sqrt();
    let start = 2.0 * before / (1.0 + speed);
    let end = ended(asking, &Problem::of_stages(1.0, 1.0, stages).with_exit(before + 0.4), start)?;
    let h = end.time - start;
    (h > 0.0).then(|| Constant {
        velocity: (speed - end.velocity) / (DECELERATION * h),
        depth: (speed * h - (end.depth - before)) / (DECELERATION * h * h),
    })
}

/// The end of the first step after the time `start` (s) under a constant deceleration, where no step lands on an exit.
fn not_landed(asking: &mut Asking<'_>, problem: &Problem, start: f64) -> Option<State> {
    let before = problem.start_of(problem.stages.len() - 1);
    let [one, other] = BEHIND.map(|part| {
        let (time, late) = (start + (1.0 + part) * NOT_LANDED, part * NOT_LANDED);
        let found = state_at(asking, problem, [NOT_LANDED, time, before + (1.0 + part) * NOT_LANDED])?;
        let velocity = found.velocity + DECELERATION * late;
        let depth = found.depth - velocity * late + 0.5 * DECELERATION * late * late;
        Some(State { time: start + NOT_LANDED, depth, velocity })
    });
    let (one, other) = (one?, other?);
    let is_same = |a: f64, b: f64| (a - b).abs() <= 0.1 * SAME * DECELERATION * NOT_LANDED * NOT_LANDED;
    (is_same(one.depth, other.depth) && is_same(one.velocity, other.velocity)).then_some(one)
}

/// Whether the last of two steps, onto the exit, lasts the distance left over V at its start, under a constant deceleration,
/// where the whole step before it is right.
fn lands_straight(asking: &mut Asking<'_>) -> bool {
    let (step, exit) = (0.3, 0.4);
    let problem = Problem::of_stages(1.0, 1.0, [Stage::tunnel(DECELERATION, 0.0)]).with_exit(exit);
    let request = PeerRequest { dt_s: Some(step), ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
    let Ok(answer) = asking.ask(&request) else { return false };
    let [depth, speed] = [step - 0.5 * DECELERATION * step * step, 1.0 - DECELERATION * step];
    let straight = step + (exit - depth) / speed;
    (answer.time_s - straight).abs() <= LANDED * straight
}

/// A velocity that is off from the start on by a part of what a step takes: `V + a t` stays `V0 - k a h` under a constant
/// deceleration. A central difference that takes V0 for the velocity half a step before has k = 1/2.
fn start_kick(asking: &mut Asking<'_>) -> Option<Cause> {
    const STEPS: [f64; 4] = [0.1, 0.043, 0.021, 0.0097];
    let problem = Problem::of_stages(1.0, 1.0, [Stage::tunnel(DECELERATION, 0.0)]).with_exit(0.4);
    let lost = STEPS.map(|step| {
        let request = PeerRequest { dt_s: Some(step), ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
        let end = end_of(&asking.ask(&request).ok()?).state;
        let by_depth = (end.velocity * end.velocity + 2.0 * DECELERATION * end.depth).sqrt();
        let by_time = end.velocity + DECELERATION * end.time;
        ((by_depth - by_time).abs() <= SAME).then_some((1.0 - by_depth) / (DECELERATION * step))
    });
    let all: Vec<f64> = lost.into_iter().collect::<Option<_>>()?;
    let part = all[0];
    let is_one = all.iter().all(|lost| (lost - part).abs() <= ANOTHER * part.abs());
    let of_half = if (part - 0.5).abs() <= ANOTHER { ": V0 is taken for V half a step before the impact" } else { "" };
    let statement = format!(
        "under a constant deceleration a, V is {:.6} a h too {} from the start on, whatever the step h{of_half}",
        part.abs(),
        if part > 0.0 { "small" } else { "great" }
    );
    (part.abs() > ANOTHER && is_one)
        .then(|| Cause::plain("start-kick", statement, Certainty::Certain, STEPS.len(), STEPS.len()))
}

/// By how much of `a h` V is off behind the end of a stage, whatever the step h, and whether it is right where the force is the same
/// on both sides. A scheme of several steps that keeps its slopes is off by a half.
fn kick_behind(asking: &mut Asking<'_>) -> Option<(f64, bool)> {
    const STEPS: [f64; 3] = [0.043, 0.021, 0.0097];
    const END: f64 = 0.25;
    let mut of = |of_first: f64| -> Option<f64> {
        let stages = [Stage::tunnel(of_first, 0.0).until(END), Stage::tunnel(DECELERATION, 0.0)];
        let problem = Problem::of_stages(1.0, 1.0, stages).with_exit(END + 0.4);
        let speed = (1.0 - 2.0 * of_first * END).sqrt();
        let parts = STEPS.map(|step| {
            let request = PeerRequest { dt_s: Some(step), ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
            let end = end_of(&asking.ask(&request).ok()?).state;
            let time = end.time - 2.0 * END / (1.0 + speed);
            Some((end.velocity - speed + DECELERATION * time) / (DECELERATION * step))
        });
        let [first, others @ ..] = parts;
        let (first, others) = (first?, others.into_iter().collect::<Option<Vec<f64>>>()?);
        others.iter().all(|part| (part - first).abs() <= ANOTHER).then_some(first)
    };
    let part = of(0.0).filter(|part| part.abs() > ANOTHER)?;
    Some((part, of(DECELERATION).is_some_and(|same| same.abs() <= ANOTHER)))
}

/// c1, c2 ... of a step under `V' = -r V`, if a polynomial it is.
fn coefficients(asking: &mut Asking<'_>) -> Option<SVector<f64, COEFFICIENTS>> {
    let mut step = |size: f64| {
        // With r = M/s the step is as long as the exit is deep, nearly.
        let depth = 1.0 - (-size).exp();
        let viscous = Stage { viscosity: 1.0, ..Stage::free() };
        let end = landed(asking, &Problem::of_stages(1.0, 1.0, [viscous]).with_exit(depth), 0.0)?;
        Some((-end.time, (end.velocity - 1.0) / -end.time))
    };
    let points: Vec<(f64, f64)> = SIZES.into_iter().map(&mut step).collect::<Option<_>>()?;
    let powers = SMatrix::<f64, COEFFICIENTS, COEFFICIENTS>::from_fn(|row, column| points[row].0.powi(column as i32));
    let values = SVector::<f64, COEFFICIENTS>::from_fn(|row, _| points[row].1);
    let found = powers.lu().solve(&values)?;
    let (z, value) = step(FORETOLD)?;
    let foretold: f64 = found.iter().rev().fold(0.0, |sum, coefficient| sum * z + coefficient);
    ((foretold - value).abs() <= SAME * SAME.sqrt()).then_some(found)
}

/// Which number of the classical scheme of Runge and Kutta, changed alone, gives these coefficients; two may.
fn changed_number(found: &SVector<f64, COEFFICIENTS>) -> Option<String> {
    let right = [0.5, 0.5, 1.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
    let of = |[a2, a3, a4, b1, b2, b3, b4]: [f64; 7]| {
        [b1 + b2 + b3 + b4, b2 * a2 + b3 * a3 + b4 * a4, b3 * a3 * a2 + b4 * a4 * a3, b4 * a4 * a3 * a2]
    };
    let base = of(right);
    let fitting = (0..right.len()).filter_map(|which| {
        let with = |number: f64| {
            let mut numbers = right;
            numbers[which] = number;
            of(numbers)
        };
        // Each coefficient is linear in each number.
        let slope = with(right[which] + 1.0);
        let moved = (0..base.len()).find(|k| (slope[*k] - base[*k]).abs() > SAME)?;
        let number = right[which] + (found[moved] - base[moved]) / (slope[moved] - base[moved]);
        let fits = with(number).iter().zip(found.iter()).all(|(a, b)| (a - b).abs() <= SAME);
        let is_changed = (number - right[which]).abs() > SAME;
        (fits && is_changed).then(|| match which {
            0..3 => format!("slope {} taken at {number:.6} h, not {}", which + 2, right[which]),
            _ => format!("a weight of {number:.6} for slope {}, not {:.6}", which - 2, right[which]),
        })
    });
    let all: Vec<String> = fitting.collect();
    (!all.is_empty()).then(|| format!("as of Runge-Kutta 4 with {}", all.join(", or ")))
}
