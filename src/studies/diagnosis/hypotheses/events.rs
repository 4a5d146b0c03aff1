//! Faults of events: ends of stages, exit and rest that are late, early, misplaced, missed, or change the state.

use std::f64::consts::FRAC_PI_2;

use super::super::questions::Question;
use super::super::simulation::{Passage, Rules, Simulated, continued, simulate, solve};
use super::force::{DRAG, STATIC_FORCE, STIFFNESS, VISCOSITY, clear_speed, greatest_end, reorder, term_of};
use super::{COUNTS, Change, Hypothesis, Parameter, of};
use crate::physics::{Problem, Stage, State};

/// The ends that a flight may miss: from stage `j`, whose law goes on, up to stage `m`, as `8 j + m`.
fn ends_missed(question: &Question) -> Vec<f64> {
    let count = question.problem.stages.len();
    let pairs = (0..count).flat_map(|from| (from + 1..count).map(move |to| (8 * from + to) as f64));
    std::iter::once(0.0).chain(pairs).collect()
}

fn miss_ends(problem: &mut Problem, number: f64) {
    let (from, to) = (number as usize / 8, number as usize % 8);
    if to > from
        && let Some(end) = problem.stages.get(to).map(|stage| stage.end)
    {
        problem.stages[from].end = end;
        problem.stages.drain(from + 1..=to);
    }
}

/// The state a distance (m) behind an end of a stage, where the law before it goes on.
fn overshot(&Passage { problem, index, .. }: &Passage<'_>, state: State, by: f64) -> State {
    continued(problem, index, state, by / state.velocity).unwrap_or(State { time: f64::NAN, ..state })
}

/// The velocity at `depth` in a stage, of its static force and its spring alone.
fn without_speed_terms(&Passage { problem, index, start }: &Passage<'_>, depth: f64) -> f64 {
    let Stage { static_force, stiffness, .. } = problem.stages[index];
    let work = (depth - start.depth) * (static_force + 0.5 * stiffness * (depth + start.depth));
    (start.velocity * start.velocity - 2.0 * work / problem.mass).max(0.0).sqrt()
}

/// A rest by a deceleration that is that of the flight at a `speed` from there on.
fn stop_evenly(problem: &Problem, found: &mut Simulated, speed: f64) {
    if found.end.velocity != 0.0 || found.end.depth >= problem.exit_depth || speed >= problem.impact_speed {
        return;
    }
    let Some(at) = simulate(problem, Rules { rest_speed: speed, ..Rules::default() }) else { return };
    let State { time, depth, velocity } = at.end;
    let deceleration = problem.stages[at.stage].force(depth, velocity) / problem.mass;
    let rest = depth + 0.5 * velocity * velocity / deceleration;
    if depth < problem.exit_depth && rest <= problem.limit_of(at.stage) {
        found.end = State { time: time + velocity / deceleration, depth: rest, velocity: 0.0 };
    }
}

/// The flight where V² behind the crater is `square`, and so is the time there: the projectile rests where it is not positive, at the depth
/// to which the spring alone takes it, or, `by_energy`, where it rests there rightly too.
pub(super) fn behind_crater(problem: &Problem, found: &mut Simulated, square: f64, by_energy: bool) {
    let Stage { stiffness, end: depth, .. } = problem.stages[0];
    let frequency = (stiffness / problem.mass).sqrt();
    let is_right = by_energy && problem.impact_speed <= frequency * depth;
    if problem.crater != Some(0) || problem.exit_depth <= depth || is_right {
        return;
    }
    if !square.is_finite() {
        found.end.time = f64::NAN;
        return;
    }
    if square <= 0.0 {
        let end = State { time: FRAC_PI_2 / frequency, depth: problem.impact_speed / frequency, velocity: 0.0 };
        *found = Simulated { end, stage: 0, passed: Vec::new() };
        return;
    }
    let velocity = square.sqrt();
    // The crater is crossed without a force, and its time put right.
    let mut behind = problem.clone();
    behind.impact_speed = velocity;
    behind.stages[0] = Stage::free().until(depth);
    let Some(flight) = solve(&behind) else { return };
    let late = (frequency * depth).atan2(velocity) / frequency - depth / velocity;
    *found = flight;
    found.passed.iter_mut().for_each(|(_, state)| state.time += late);
    found.end.time += late;
}

/// The flight where V behind the crater is that of a force that goes on into the tunnel.
fn crater_of_one_force(problem: &Problem, found: &mut Simulated, by_energy: bool) {
    if problem.crater == Some(0) {
        let at = Passage { problem, index: 0, start: State::at_impact(problem) };
        behind_crater(problem, found, of_one_force(&at, problem.stages[0].end).powi(2), by_energy);
    }
}

/// The stage behind the crater, of static force and drag alone, by its formulas.
struct Tunnel {
    start: f64,
    /// V² at its start, by the spring of the crater: below zero where the flight rests there.
    square: f64,
    /// p/M and 2 q/M.
    deceleration: f64,
    rate: f64,
}

impl Tunnel {
    fn behind_crater(problem: &Problem) -> Option<Self> {
        let [crater, law, ..] = &problem.stages[..] else { return None };
        let square = problem.impact_speed.powi(2) - crater.stiffness * crater.end.powi(2) / problem.mass;
        let [deceleration, rate] = [law.static_force, 2.0 * law.drag].map(|term| term / problem.mass);
        let is_plain = law.stiffness == 0.0 && law.viscosity == 0.0 && deceleration > 0.0 && rate >= 0.0;
        (problem.crater == Some(0) && is_plain).then_some(Self { start: crater.end, square, deceleration, rate })
    }

    /// The depth at rest.
    fn rest(&self) -> f64 {
        let way = match self.rate {
            0.0 => 0.5 * self.square / self.deceleration,
            rate => (0.5 * rate * self.square / self.deceleration).ln_1p() / rate,
        };
        self.start + way
    }

    /// V at a depth.
    fn velocity(&self, depth: f64) -> f64 {
        let way = depth - self.start;
        let lost = match self.rate {
            0.0 => -2.0 * self.deceleration * way,
            rate => 2.0 * self.deceleration / rate * (-rate * way).exp_m1(),
        };
        (self.square * (-self.rate * way).exp() + lost).sqrt()
    }

    /// The time that it takes to slow down from a velocity to rest.
    fn time_to_rest(&self, velocity: f64) -> f64 {
        let root = (0.5 * self.rate / self.deceleration).sqrt();
        if root == 0.0 { velocity / self.deceleration } else { (root * velocity).atan() / (root * self.deceleration) }
    }
}

/// The flight where no rest is looked for in the crater: its depth, or V at an exit before it, is that by the formula for the tunnel, and its
/// time there counts from V = 0.
fn rest_by_tunnel(problem: &Problem, found: &mut Simulated) {
    let Some(tunnel) = Tunnel::behind_crater(problem).filter(|_| found.stage == 0 && found.end.velocity <= 0.0) else {
        return;
    };
    found.end.depth = tunnel.rest();
    if found.end.depth > problem.exit_depth {
        let velocity = tunnel.velocity(problem.exit_depth);
        let time = found.end.time - tunnel.time_to_rest(velocity);
        found.end = State { time, depth: problem.exit_depth, velocity };
    }
}

/// The flight where no exit is looked for in the crater: time and velocity are those of the tunnel, taken back to it.
fn exit_by_tunnel(problem: &Problem, found: &mut Simulated) {
    let Some(tunnel) = Tunnel::behind_crater(problem) else { return };
    if found.stage > 0 || problem.exit_depth >= tunnel.start || found.end.depth < problem.exit_depth {
        return;
    }
    let frequency = (problem.stages[0].stiffness / problem.mass).sqrt();
    found.end = if tunnel.square <= 0.0 {
        State { time: FRAC_PI_2 / frequency, depth: problem.impact_speed / frequency, velocity: 0.0 }
    } else {
        let (speed, velocity) = (tunnel.square.sqrt(), tunnel.velocity(problem.exit_depth));
        let early = tunnel.time_to_rest(velocity) - tunnel.time_to_rest(speed);
        let time = (frequency * tunnel.start).atan2(speed) / frequency - early;
        State { time, depth: problem.exit_depth, velocity }
    };
}

/// The velocity at `depth` in a stage, as if it had no term but those of `KEPT`: p, s, r and q are its bits from the first on.
fn of_terms<const KEPT: u8>(&Passage { problem, index, start }: &Passage<'_>, depth: f64) -> f64 {
    let way = depth - start.depth;
    if !(way > 0.0 && start.velocity > 0.0) {
        return start.velocity;
    }
    let mut law = problem.stages[index].until(f64::INFINITY);
    for term in [STATIC_FORCE, STIFFNESS, VISCOSITY, DRAG] {
        if KEPT & (1 << term) == 0 {
            *term_of(&mut law, term) = 0.0;
        }
    }
    // From its start on.
    law.static_force += law.stiffness * start.depth;
    let alone = Problem::of_stages(problem.mass, start.velocity, [law]).with_exit(way);
    solve(&alone).map_or(f64::NAN, |found| found.end.velocity)
}

/// The state a distance (m) before an end of a stage.
fn ahead_of(&Passage { problem, index, start }: &Passage<'_>, state: State, by: f64) -> Option<State> {
    const ROUNDS: usize = 8;
    let depth = state.depth - by;
    let mut early = by / state.velocity;
    let mut found = None;
    for _ in 0..ROUNDS {
        let there = continued(problem, index, state, -early).filter(|there| there.velocity > 0.0)?;
        early += (there.depth - depth) / there.velocity;
        found = Some(there);
    }
    found.filter(|there| there.depth >= start.depth && (there.depth - depth).abs() <= 1e-9 * by)
}

/// The end of a stage as it seems from a state before it, or behind: at one velocity, or at one deceleration. There is none where
/// that deceleration stops it on the way.
fn extrapolated(at: &Passage<'_>, end: State, from: Option<State>, is_even: bool) -> State {
    let none = State { time: f64::NAN, ..end };
    let Some(State { time, depth, velocity }) = from else { return none };
    let way = end.depth - depth;
    let force = if is_even { 0.0 } else { at.problem.stages[at.index].force(depth, velocity) };
    let square = velocity * velocity - 2.0 * way * force / at.problem.mass;
    if square <= 0.0 {
        return none;
    }
    let there = square.sqrt();
    State { time: time + 2.0 * way / (velocity + there), depth: end.depth, velocity: there }
}

fn exit_from_each_start(problem: &mut Problem) {
    let seen = |index: usize| {
        Some(problem.start_of(index) + problem.exit_depth).filter(|exit| *exit <= problem.stages[index].end)
    };
    problem.exit_depth = (0..problem.stages.len()).find_map(seen).unwrap_or(f64::INFINITY);
}

/// Stages that the exit cuts are left out, and the next one acts from their start on.
fn leave_out_cut_stages(problem: &mut Problem) {
    let exit = problem.exit_depth;
    if problem.stages[0].end > exit {
        problem.crater = None;
    }
    problem.stages.retain(|law| law.end <= exit || law.end.is_infinite());
}

fn exit_at_start_of_last(problem: &mut Problem) {
    let start = problem.start_of(problem.stages.len() - 1);
    problem.exit_depth = problem.exit_depth.max(start);
}

fn rest_late(problem: &Problem, found: &mut Simulated, late: f64) {
    if found.end.velocity > 0.0 {
        return;
    }
    let none = State { time: f64::NAN, ..found.end };
    found.end = continued(problem, found.stage, found.end, late).unwrap_or(none);
}

/// The stage `index` left out; what follows takes its place, or what is before it goes on.
fn leave_out(problem: &mut Problem, index: usize, is_before: bool) {
    if index + 1 < problem.stages.len() {
        let gone = problem.stages.remove(index);
        if is_before && index > 0 {
            problem.stages[index - 1].end = gone.end;
        }
    }
}

/// Stages thinner than `least` (m) left out.
fn leave_out_thin(problem: &mut Problem, least: f64, is_before: bool) {
    let thick: Vec<f64> =
        (0..problem.stages.len()).map(|index| problem.stages[index].end - problem.start_of(index)).collect();
    for index in (0..thick.len()).rev().filter(|index| thick[*index] < least) {
        leave_out(problem, index, is_before);
    }
}

fn thicknesses(question: &Question) -> Vec<f64> {
    let problem = &question.problem;
    (0..problem.stages.len()).map(|index| problem.stages[index].end - problem.start_of(index)).collect()
}

/// The first stages alone; the last of them goes on.
fn cut_stages(problem: &mut Problem, count: usize) {
    problem.stages.truncate(count);
    if let Some(last) = problem.stages.last_mut() {
        last.end = f64::INFINITY;
    }
}

/// The flight ends at a depth, wherever it is.
fn end_at(problem: &mut Problem, depth: f64) {
    problem.exit_depth = problem.exit_depth.min(depth);
}

/// The exit seen where `is_seen` of its stage, or at the end of that.
fn exit_in(problem: &mut Problem, is_seen: impl Fn(usize) -> bool, is_late: bool) {
    let stage = problem.stages.iter().position(|law| problem.exit_depth <= law.end);
    if let Some(stage) = stage.filter(|stage| problem.has_exit() && !is_seen(*stage)) {
        problem.exit_depth = if is_late { problem.stages[stage].end } else { f64::INFINITY };
    }
}

/// Time and velocity at an exit that are those at the end of its stage, or of rest before that, unless it `is_seen`.
fn state_at_end_of_stage(problem: &Problem, found: &mut Simulated, is_seen: impl Fn(usize) -> bool) {
    let mut moved = problem.clone();
    exit_in(&mut moved, is_seen, true);
    if found.end.depth >= problem.exit_depth
        && let Some(Simulated { end, .. }) = solve(&moved)
    {
        found.end = if end.velocity > 0.0 { State { depth: problem.exit_depth, ..end } } else { end };
    }
}

/// V behind a crater of the depth k d whose force goes on into the tunnel: `c k d = P + Q V²` and `M (V0² - V²) = c (k d)²`.
fn of_one_force(at: &Passage<'_>, depth: f64) -> f64 {
    let (mass, tunnel, impact) = (at.problem.mass, at.problem.stages[at.index + 1], at.start.velocity);
    let square = (mass * impact * impact - depth * tunnel.static_force) / (mass + depth * tunnel.drag);
    square.max(0.0).sqrt()
}

/// The velocity at the exit, in numbers that a threshold may lie between.
fn exit_speed(question: &Question) -> Vec<f64> {
    if question.exact.end.depth >= question.problem.exit_depth { vec![question.exact.end.velocity] } else { Vec::new() }
}

/// The same over the impact speed.
fn exit_share(question: &Question) -> Vec<f64> {
    exit_speed(question).iter().map(|speed| speed / question.problem.impact_speed).collect()
}

fn exit_depth(question: &Question) -> Vec<f64> {
    vec![question.problem.exit_depth]
}

/// The depth of an exit that lies elsewhere is reported as that of the question.
fn right_exit(found: &mut Simulated, is_through: bool, depth: f64) {
    if is_through {
        found.end.depth = depth;
    }
}

/// The end taken a time later, or earlier, whichever it is.
fn end_late(problem: &Problem, found: &mut Simulated, late: f64) {
    let none = State { time: f64::NAN, ..found.end };
    found.end = continued(problem, found.stage, found.end, late).unwrap_or(none);
}

/// Faults of events.
pub(super) static FAULTS: &[Hypothesis] = &[
    of(
        "stage-end-missed",
        "no end of a stage is seen: the law of the first one holds throughout",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |_, _| 0))],
    ),
    of(
        "stage-end-missed",
        "the end of the first stage alone is seen: the law of the second one holds from there on",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |index, _| index.min(1)))],
    ),
    of(
        "stage-end-missed",
        "ends of stages are missed now and then, and the law before them goes on",
        Parameter::Choice(ends_missed),
        &[Change::Problem(miss_ends)],
    ),
    of(
        "stage-end-misplaced",
        "stages end at {} times their ends",
        Parameter::Factor,
        &[Change::Problem(|p, f| p.stages.iter_mut().for_each(|law| law.end *= f))],
    ),
    of(
        "stage-end-misplaced",
        "the ends of stages are taken for their lengths",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let mut sum = 0.0;
            for law in &mut p.stages {
                sum += law.end;
                law.end = sum;
            }
        })],
    ),
    of(
        "stage-end-misplaced",
        "stages end {} m too early",
        Parameter::Value(1e-3),
        &[Change::Problem(|p, by| p.stages.iter_mut().for_each(|law| law.end = (law.end - by).max(0.0)))],
    ),
    of(
        "stage-end-misplaced",
        "stages end {} m too late",
        Parameter::Value(1e-3),
        &[Change::Problem(|p, by| p.stages.iter_mut().for_each(|law| law.end += by))],
    ),
    of(
        "exit-misplaced",
        "the exit lies at {} times its depth",
        Parameter::Factor,
        &[Change::Problem(|p, f| p.exit_depth *= f)],
    ),
    of(
        "exit-misplaced",
        "the exit lies {} m too near",
        Parameter::Value(0.3),
        &[Change::Problem(|p, by| p.exit_depth -= by)],
    ),
    of(
        "exit-misplaced",
        "the exit lies {} m too deep",
        Parameter::Value(0.3),
        &[Change::Problem(|p, by| p.exit_depth += by)],
    ),
    of(
        "exit-misplaced",
        "the exit is counted from the start of the last stage",
        Parameter::None,
        &[Change::Problem(|p, _| p.exit_depth += p.start_of(p.stages.len() - 1))],
    ),
    of(
        "exit-misplaced",
        "the exit is counted from the start of each stage",
        Parameter::None,
        &[Change::Problem(|p, _| exit_from_each_start(p))],
    ),
    of(
        "exit-misplaced",
        "the exit is counted from the start of each stage, and its depth is reported right",
        Parameter::None,
        &[
            Change::Problem(|p, _| exit_from_each_start(p)),
            Change::Report(|p, found, _| {
                right_exit(found, found.end.depth >= p.exit_depth, p.exit_depth - p.start_of(found.stage));
            }),
        ],
    ),
    of(
        "exit-misplaced",
        "the exit is that of the last end of a stage",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let start = p.start_of(p.stages.len() - 1);
            if p.has_exit() && start > 0.0 {
                p.exit_depth = start;
            }
        })],
    ),
    of(
        "exit-ignored",
        "the exit is ignored: the flight goes on to rest",
        Parameter::None,
        &[Change::Problem(|p, _| p.exit_depth = f64::INFINITY)],
    ),
    of(
        "exit-missed",
        "an exit at the very end of a stage is missed",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.stages.iter().any(|law| law.end == p.exit_depth) {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-missed",
        "exit and ends of stages are missed where the projectile comes to rest just beyond them, within one step",
        Parameter::Choice(ends_missed),
        &[Change::Problem(|p, number| {
            p.exit_depth = f64::INFINITY;
            miss_ends(p, number);
        })],
    ),
    of(
        "exit-missed",
        "the exit is missed where the projectile comes to rest just beyond it, within one step",
        Parameter::Choice(|_| vec![1.0]),
        &[Change::Problem(|p, _| p.exit_depth = f64::INFINITY)],
    ),
    of(
        "stage-left-out",
        "a stage whose end lies beyond the exit is left out, and the next one acts in its place",
        Parameter::None,
        &[Change::Problem(|p, _| leave_out_cut_stages(p))],
    ),
    of(
        "exit-last-stage-only",
        "the exit is looked for in the last stage alone, and seen as soon as that is entered",
        Parameter::None,
        &[Change::Problem(|p, _| exit_at_start_of_last(p))],
    ),
    of(
        "exit-last-stage-only",
        "the exit is looked for in the last stage alone, and not seen before it",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.exit_depth <= p.start_of(p.stages.len() - 1) {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-first-stage-missed",
        "no exit is looked for in the crater: time and V at one are those of the tunnel taken back to it",
        Parameter::None,
        &[Change::Report(|p, found, _| exit_by_tunnel(p, found))],
    ),
    of(
        "rest-missed",
        "no rest is looked for in the crater: the depth of one is that by the formula for the tunnel, with V² below zero behind the crater",
        Parameter::None,
        &[Change::Report(|p, found, _| rest_by_tunnel(p, found))],
    ),
    of(
        "exit-first-stage-missed",
        "the exit is not looked for in the first stage, and seen as soon as that is left",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.stages[0].end.is_finite() {
                p.exit_depth = p.exit_depth.max(p.stages[0].end);
            }
        })],
    ),
    of(
        "exit-first-stage-missed",
        "the exit is not looked for in the first stage",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.exit_depth <= p.stages[0].end {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-first-stage-only",
        "the exit is looked for in the first stage alone",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.exit_depth > p.stages[0].end {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} m/s, and that speed is reported",
        Parameter::Speed,
        &[Change::RestSpeed(|_, speed| speed)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} m/s",
        Parameter::Speed,
        &[Change::RestSpeed(|_, speed| speed), Change::Report(|_, found, speed| clear_speed(found, speed))],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} V0, and that speed is reported",
        Parameter::Fraction,
        &[Change::RestSpeed(|p, part| part * p.impact_speed)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} V0",
        Parameter::Fraction,
        &[
            Change::RestSpeed(|p, part| part * p.impact_speed),
            Change::Report(|p, found, part| clear_speed(found, part * p.impact_speed)),
        ],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} times V at the start of the stage, and that speed is reported",
        Parameter::Fraction,
        &[Change::RestPart],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} times V at the start of the stage",
        Parameter::Fraction,
        &[
            Change::RestPart,
            Change::Report(|p, found, _| {
                if found.end.depth < p.exit_depth {
                    found.end.velocity = 0.0;
                }
            }),
        ],
    ),
    of(
        "rest-threshold",
        "a velocity below {} m/s is reported as zero at the exit too",
        Parameter::Threshold(30.0, exit_speed),
        &[Change::Report(|_, found, speed| clear_speed(found, speed))],
    ),
    of(
        "rest-threshold",
        "a velocity below {} V0 is reported as zero at the exit too",
        Parameter::Threshold(0.3, exit_share),
        &[Change::Report(|p, found, part| clear_speed(found, part * p.impact_speed))],
    ),
    of(
        "exit-late",
        "the exit is taken at the end of the step that passes it",
        Parameter::Delay,
        &[Change::Problem(|p, delay| p.exit_depth += delay)],
    ),
    of(
        "exit-late",
        "time and velocity at the exit are those of the end of the step that passes it",
        Parameter::Delay,
        &[
            Change::Problem(|p, delay| p.exit_depth += delay),
            Change::Report(|p, found, delay| {
                if found.end.depth >= p.exit_depth {
                    found.end.depth -= delay;
                }
            }),
        ],
    ),
    of(
        "exit-velocity-late",
        "V at the exit is that of the end of the step that passes it, and depth and time are right",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| {
            if found.end.depth >= p.exit_depth {
                found.end.velocity =
                    continued(p, found.stage, found.end, late).map_or(f64::NAN, |state| state.velocity);
            }
        })],
    ),
    of(
        "rest-late",
        "rest is taken at the end of the step in which V changes its sign",
        Parameter::Lateness,
        &[Change::Report(rest_late)],
    ),
    of(
        "rest-late",
        "rest is taken at the end of the step in which V changes its sign, with V = 0",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| {
            rest_late(p, found, late);
            found.end.velocity = found.end.velocity.max(0.0);
        })],
    ),
    of(
        "rest-early",
        "the flight ends at the last step before rest",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| rest_late(p, found, -late))],
    ),
    of(
        "rest-early",
        "the flight ends at the last step before rest, with V = 0",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| {
            let is_rest = found.end.velocity <= 0.0;
            rest_late(p, found, -late);
            if is_rest {
                found.end.velocity = 0.0;
            }
        })],
    ),
    of(
        "stage-end-late",
        "the end of a stage is taken at the end of the step that passes it",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| *state = overshot(at, *state, by))],
    ),
    of(
        "stage-end-late",
        "V and time at the end of a stage are those of the end of the step that passes it, and its depth is right",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| *state = State { depth: state.depth, ..overshot(at, *state, by) })],
    ),
    of(
        "stage-end-late",
        "V at the end of a stage is that of the end of the step that passes it, and depth and time are right",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| state.velocity = overshot(at, *state, by).velocity)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below a kinetic energy of {} J, and its speed is reported",
        Parameter::Value(0.3),
        &[Change::RestSpeed(|p, energy| (2.0 * energy / p.mass).sqrt())],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below a kinetic energy of {} J",
        Parameter::Value(0.3),
        &[
            Change::RestSpeed(|p, energy| (2.0 * energy / p.mass).sqrt()),
            Change::Report(|p, found, energy| clear_speed(found, (2.0 * energy / p.mass).sqrt())),
        ],
    ),
    of(
        "flight-cut-short",
        "the flight ends after {} s, wherever it is",
        Parameter::Value(0.3),
        &[Change::EndTime(|_, _, time| time)],
    ),
    of(
        "flight-cut-short",
        "the flight ends on its way: at a number of steps, or where a step fails",
        Parameter::Lateness,
        &[Change::EndTime(|_, end, early| (end - early).max(0.0))],
    ),
    of(
        "stage-end-velocity",
        "V is {} times the right one behind each end of a stage",
        Parameter::Factor,
        &[Change::AtStageEnd(|_, state, f| state.velocity *= f)],
    ),
    of(
        "stage-end-velocity",
        "V is the impact speed again behind each end of a stage",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = at.problem.impact_speed)],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that of its start",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = at.start.velocity)],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that of its static force and its spring alone",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = without_speed_terms(at, state.depth))],
    ),
    of(
        "time-restarts",
        "the time doubles at each end of a stage: the time of its end is added to that of its start",
        Parameter::None,
        &[Change::AtStageEnd(|_, state, _| state.time *= 2.0)],
    ),
    of(
        "time-restarts",
        "the time doubles at the start of each stage that has a force: the time of its end is added to that of its start",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| {
            let has_force = at.problem.stages.get(at.index + 1).is_some_and(|law| law.force(1.0, 1.0) != 0.0);
            state.time *= if has_force { 2.0 } else { 1.0 };
        })],
    ),
    of(
        "stage-left-out",
        "the stage with the index {} is left out, and the next one begins in its place",
        Parameter::OneOf(COUNTS),
        &[Change::Problem(|p, n| leave_out(p, n as usize, false))],
    ),
    of(
        "stage-left-out",
        "the stage with the index {} is left out, and the one before goes on",
        Parameter::OneOf(COUNTS),
        &[Change::Problem(|p, n| leave_out(p, n as usize, true))],
    ),
    of(
        "stage-left-out",
        "stages thinner than {} m are left out, and the next one begins in their place",
        Parameter::Threshold(0.01, thicknesses),
        &[Change::Problem(|p, n| leave_out_thin(p, n, false))],
    ),
    of(
        "stage-left-out",
        "stages thinner than {} m are left out, and the one before goes on",
        Parameter::Threshold(0.01, thicknesses),
        &[Change::Problem(|p, n| leave_out_thin(p, n, true))],
    ),
    of(
        "stage-end-missed",
        "only the first {} stages are known, and the last of them goes on",
        Parameter::OneOf(COUNTS),
        &[Change::Problem(|p, n| cut_stages(p, n as usize))],
    ),
    of(
        "stage-end-missed",
        "a stage without thickness does not end, and its law goes on",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if let Some(thin) = (0..p.stages.len()).find(|index| p.stages[*index].end <= p.start_of(*index)) {
                cut_stages(p, thin + 1);
            }
        })],
    ),
    of(
        "stage-end-misplaced",
        "a stage is at least {} m thick, and those behind it move",
        Parameter::Value(0.03),
        &[Change::Problem(|p, n| {
            let mut by = 0.0_f64;
            let starts: Vec<f64> = (0..p.stages.len()).map(|index| p.start_of(index)).collect();
            for (law, start) in p.stages.iter_mut().zip(starts) {
                by += (n - (law.end - start)).max(0.0);
                law.end += by;
            }
        })],
    ),
    of(
        "stage-end-misplaced",
        "a stage is at least {} m thick, at the cost of those behind it",
        Parameter::Value(0.03),
        &[Change::Problem(|p, n| {
            let mut start = 0.0;
            for law in &mut p.stages {
                law.end = law.end.max(start + n);
                start = law.end;
            }
        })],
    ),
    of(
        "flight-cut-short",
        "the flight ends at the end of the first {} stages, wherever it is",
        Parameter::OneOf(COUNTS),
        &[Change::Problem(|p, n| {
            if let Some(end) = p.stages.get(n as usize - 1).map(|law| law.end) {
                end_at(p, end);
            }
        })],
    ),
    of(
        "flight-cut-short",
        "the last of several stages is never flown through",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let start = p.start_of(p.stages.len() - 1);
            if start > 0.0 {
                end_at(p, start);
            }
        })],
    ),
    of(
        "flight-cut-short",
        "the flight ends at a depth of {} m, wherever it is",
        Parameter::Value(0.3),
        &[Change::Problem(end_at)],
    ),
    of(
        "flight-cut-short",
        "the flight ends {} s after the start of a stage",
        Parameter::Value(1e-2),
        &[Change::StageTime(|_, time| time)],
    ),
    of(
        "flight-cut-short",
        "the flight ends after {} times the greatest depth of an end or the exit over V0, counted from the start of each stage",
        Parameter::Value(1.5),
        &[Change::StageTime(|p, n| n * greatest_end(p).unwrap_or(f64::INFINITY) / p.impact_speed)],
    ),
    of(
        "force-stale",
        "from {} m/s on the projectile is brought to rest by the force that it has there",
        Parameter::Speed,
        &[Change::Report(stop_evenly)],
    ),
    of(
        "force-stale",
        "from {} V0 on the projectile is brought to rest by the force that it has there",
        Parameter::Fraction,
        &[Change::Report(|p, found, part| stop_evenly(p, found, part * p.impact_speed))],
    ),
    of(
        "flight-cut-short",
        "where there is an exit, the flight ends after {} times the exit depth over V0",
        Parameter::Value(1.5),
        &[Change::EndTime(|p, _, n| n * p.exit_depth / p.impact_speed)],
    ),
    of(
        "stage-left-out",
        "stages without force are left out, and the next one begins in their place",
        Parameter::None,
        &[Change::Problem(|p, _| {
            for index in 0..p.stages.len() - 1 {
                let start = p.start_of(index);
                let law = &mut p.stages[index];
                if law.force(1.0, 1.0) == 0.0 {
                    law.end = start;
                }
            }
        })],
    ),
    of(
        "exit-invented",
        "where no exit is asked for, the start of the last stage is one",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let start = p.start_of(p.stages.len() - 1);
            if !p.has_exit() && start > 0.0 {
                p.exit_depth = start;
            }
        })],
    ),
    of(
        "exit-invented",
        "where no exit is asked for, there is one at {} m",
        Parameter::Value(0.3),
        &[Change::Problem(|p, n| {
            if !p.has_exit() {
                p.exit_depth = n;
            }
        })],
    ),
    of(
        "exit-late",
        "an exit inside a stage is seen at the end of that stage",
        Parameter::None,
        &[Change::Problem(|p, _| exit_in(p, |_| false, true))],
    ),
    of(
        "exit-late",
        "time and velocity at an exit inside a stage are those of the end of that stage, or of rest before it",
        Parameter::None,
        &[Change::Report(|p, found, _| state_at_end_of_stage(p, found, |_| false))],
    ),
    of(
        "exit-late",
        "time and velocity at an exit in front of the last stage are those of the end of its stage, or of rest before it",
        Parameter::None,
        &[Change::Report(|p, found, _| state_at_end_of_stage(p, found, |stage| stage + 1 == p.stages.len()))],
    ),
    of(
        "exit-missed",
        "an exit inside a stage is missed",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.stages.iter().all(|law| law.end != p.exit_depth) {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-missed",
        "an exit behind the first {} stages is missed",
        Parameter::OneOf(COUNTS),
        &[Change::Problem(|p, n| exit_in(p, |stage| stage < n as usize, false))],
    ),
    of(
        "exit-missed",
        "an exit behind the first {} stages is seen at the end of its stage",
        Parameter::OneOf(COUNTS),
        &[Change::Problem(|p, n| exit_in(p, |stage| stage < n as usize, true))],
    ),
    of(
        "exit-missed",
        "an exit in front of the last stage is seen at the end of its stage",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let last = p.stages.len() - 1;
            exit_in(p, |stage| stage == last, true);
        })],
    ),
    of(
        "exit-missed",
        "an exit at less than {} m/s is missed",
        Parameter::Threshold(30.0, exit_speed),
        &[Change::OfRight(|p, right, n| {
            if right.velocity < n {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-missed",
        "an exit at less than {} V0 is missed",
        Parameter::Threshold(0.3, exit_share),
        &[Change::OfRight(|p, right, n| {
            if right.velocity < n * p.impact_speed {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-missed",
        "an exit deeper than {} m is missed",
        Parameter::Threshold(0.1, exit_depth),
        &[Change::Problem(|p, n| {
            if p.exit_depth > n {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-missed",
        "an exit less deep than {} m is missed",
        Parameter::Threshold(0.1, exit_depth),
        &[Change::Problem(|p, n| {
            if p.exit_depth < n {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-misplaced",
        "the exit is looked for at {} times its depth, and its depth is reported right",
        Parameter::Factor,
        &[
            Change::Problem(|p, n| p.exit_depth *= n),
            Change::Report(|p, found, n| right_exit(found, found.end.depth >= p.exit_depth, p.exit_depth / n)),
        ],
    ),
    of(
        "exit-misplaced",
        "the exit is looked for {} m too near, and its depth is reported right",
        Parameter::Value(1e-3),
        &[
            Change::Problem(|p, n| p.exit_depth -= n),
            Change::Report(|p, found, n| right_exit(found, found.end.depth >= p.exit_depth, p.exit_depth + n)),
        ],
    ),
    of(
        "exit-misplaced",
        "the exit is looked for {} m too deep, and its depth is reported right",
        Parameter::Value(1e-3),
        &[
            Change::Problem(|p, n| p.exit_depth += n),
            Change::Report(|p, found, n| right_exit(found, found.end.depth >= p.exit_depth, p.exit_depth - n)),
        ],
    ),
    of(
        "event-late",
        "every event is taken late, in these answers by up to {} s",
        Parameter::Bracket,
        &[Change::Report(end_late)],
    ),
    of(
        "event-late",
        "every event is taken late, in these answers by up to {} s, and rest with V = 0",
        Parameter::Bracket,
        &[Change::Report(|p, found, late| {
            let is_rest = found.end.velocity <= 0.0;
            end_late(p, found, late);
            if is_rest {
                found.end.velocity = 0.0;
            }
        })],
    ),
    of(
        "event-late",
        "the end of the flight is taken up to {} s late, at the depth of the exit where there is one",
        Parameter::Bracket,
        &[Change::Report(|p, found, late| {
            let depth = found.end.depth;
            let is_rest = found.end.velocity <= 0.0;
            end_late(p, found, late);
            if is_rest {
                found.end.velocity = 0.0;
            } else {
                found.end.depth = depth;
            }
        })],
    ),
    of(
        "stage-end-nudged",
        "behind each end of a stage x is {} m deeper, with the time left as it is",
        Parameter::Value(1e-4),
        &[Change::AtStageEnd(|_, state, n| state.depth += n)],
    ),
    of(
        "stage-end-nudged",
        "behind each end of a stage x is {} m deeper, and the time with it",
        Parameter::Value(1e-4),
        &[Change::AtStageEnd(|_, state, n| {
            let from = state.depth;
            state.depth += n;
            state.time += (state.depth - from) / state.velocity;
        })],
    ),
    of(
        "stage-end-nudged",
        "behind each end of a stage x is {} times its depth deeper, with the time left as it is",
        Parameter::Value(1e-4),
        &[Change::AtStageEnd(|_, state, n| state.depth += n * state.depth)],
    ),
    of(
        "stage-end-nudged",
        "behind each end of a stage x is {} times its depth deeper, and the time with it",
        Parameter::Value(1e-4),
        &[Change::AtStageEnd(|_, state, n| {
            let from = state.depth;
            state.depth += n * state.depth;
            state.time += (state.depth - from) / state.velocity;
        })],
    ),
    of(
        "stage-end-nudged",
        "ends of stages and the exit count as reached {} m before them",
        Parameter::Value(1e-4),
        &[
            Change::Problem(|p, n| {
                p.exit_depth -= n;
                p.stages.iter_mut().for_each(|law| law.end -= n);
            }),
            Change::AtStageEnd(|_, state, n| state.depth += n),
            Change::Report(|p, found, n| right_exit(found, found.end.depth >= p.exit_depth, p.exit_depth + n)),
        ],
    ),
    of(
        "stage-end-velocity",
        "{} m/s of V are lost behind each end of a stage",
        Parameter::Value(1.0),
        &[Change::AtStageEnd(|_, state, n| state.velocity = (state.velocity - n).max(0.0))],
    ),
    of(
        "stage-end-velocity",
        "V behind the crater is that of a force that goes on into the tunnel, also where the crater stiffness is given",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| {
            if at.problem.crater == Some(at.index) {
                state.velocity = of_one_force(at, state.depth);
            }
        })],
    ),
    of(
        "stage-end-velocity",
        "V behind the crater, the time there by it and whether it is passed are those of a force that goes on into the tunnel, also where \
         the crater stiffness is given",
        Parameter::None,
        &[Change::Report(|p, found, _| crater_of_one_force(p, found, false))],
    ),
    of(
        "stage-end-velocity",
        "V behind the crater and the time there by it are those of a force that goes on into the tunnel, also where the crater stiffness \
         is given",
        Parameter::None,
        &[Change::Report(|p, found, _| crater_of_one_force(p, found, true))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that without its static force",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b1110>(at, state.depth))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that without its stiffness",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b1101>(at, state.depth))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that without its viscosity",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b1011>(at, state.depth))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that without its drag",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b0111>(at, state.depth))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that of its static force and its drag alone",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b1001>(at, state.depth))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that of its static force alone",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b0001>(at, state.depth))],
    ),
    of(
        "stage-end-velocity",
        "V behind each end of a stage is that of its drag alone",
        Parameter::None,
        &[Change::AtStageEnd(|at, state, _| state.velocity = of_terms::<0b1000>(at, state.depth))],
    ),
    of(
        "stage-end-extrapolated",
        "the way from the last step before the end of a stage to that end is taken at the V of that step",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| {
            *state = extrapolated(at, *state, ahead_of(at, *state, by), true);
        })],
    ),
    of(
        "stage-end-extrapolated",
        "the way from the last step before the end of a stage to that end is taken at the deceleration of that step",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| {
            *state = extrapolated(at, *state, ahead_of(at, *state, by), false);
        })],
    ),
    of(
        "stage-end-extrapolated",
        "the way back from the first step behind the end of a stage to that end is taken at the V of that step",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| {
            *state = extrapolated(at, *state, Some(overshot(at, *state, by)), true);
        })],
    ),
    of(
        "stage-end-extrapolated",
        "the way back from the first step behind the end of a stage to that end is taken at the deceleration of that step",
        Parameter::Overshoot,
        &[Change::AtStageEnd(|at, state, by| {
            *state = extrapolated(at, *state, Some(overshot(at, *state, by)), false);
        })],
    ),
];
