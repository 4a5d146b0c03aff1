//! A scheme of Runge and Kutta with four slopes, and what people get wrong in one.

use crate::physics::{Problem, Stage, State};

/// How an event within a step is placed.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Placed {
    /// By a part of the step.
    ByPart,
    /// On the chord of the step.
    OnChord,
    /// On the cubics by values and slopes at both ends of the step, those of V times these factors.
    OnCubic([f64; 2]),
    /// At the end of the step.
    AtStepEnd,
    /// At the end of the step, with the depth of the boundary.
    AtStepEndByDepth,
    /// By a step that lasts the distance over V at its start, with the depth of the boundary.
    AtFirstSpeed,
    /// By a part of a step of the midpoint rule.
    ByMidpoint,
}

/// A scheme.
#[derive(Clone, Copy)]
pub(super) struct Stepping {
    /// Parts of the step at which slopes two to four are taken, and the weights of all.
    pub numbers: ([f64; 3], [f64; 4]),
    /// What is done to the problem before.
    pub read: fn(&mut Problem),
    pub exit: Placed,
    pub rest: Placed,
    pub stage_end: Placed,
    /// Velocity at an exit, from those at the start of the step, at the exit and at the end of the step.
    pub exit_speed: fn([f64; 3]) -> f64,
    /// Steps of a flight without `dt_s`, from tolerance and impact speed.
    pub steps: fn(f64, f64) -> f64,
    /// The step that is taken for the one asked for.
    pub step: fn(f64) -> f64,
    /// Time that a shortened step takes, from its length and that of a whole one, and whether the flight ends with it.
    pub clock: fn(f64, f64, bool) -> f64,
    /// Whether x is advanced by the mean of V at both ends of a step.
    pub by_mean_speed: bool,
    /// Part of the force of the stage before in the first slope behind its end.
    pub stale: f64,
    /// Part of the change of V that the first step behind the end of a stage makes.
    pub restart: f64,
    /// Parts by which depth and velocity in the force stay behind, at those of the start of the step.
    pub lag: [f64; 2],
    /// Steps by which V0 is taken for an earlier velocity.
    pub kick: f64,
    /// Part of V0 at which it counts as at rest.
    pub rest_speed: f64,
    /// Halvings of a step, in which an event is located.
    pub halvings: usize,
    /// Whether it takes `dt_s`.
    pub is_fixed: bool,
}

/// The slopes and weights of the classical scheme.
pub(super) const CLASSICAL: ([f64; 3], [f64; 4]) = ([0.5, 0.5, 1.0], [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]);

/// Those of the midpoint rule.
const MIDPOINT: ([f64; 3], [f64; 4]) = ([0.5, 0.5, 1.0], [0.0, 1.0, 0.0, 0.0]);

/// The classical scheme, right.
pub(super) const RIGHT: Stepping = Stepping {
    numbers: CLASSICAL,
    read: |_| (),
    exit: Placed::ByPart,
    rest: Placed::ByPart,
    stage_end: Placed::ByPart,
    exit_speed: |[_, here, _]| here,
    steps: |_, _| 200.0,
    step: |step| step,
    clock: |part, _, _| part,
    by_mean_speed: false,
    stale: 0.0,
    restart: 1.0,
    lag: [0.0; 2],
    kick: 0.0,
    rest_speed: 0.0,
    halvings: 100,
    is_fixed: false,
};

/// Steps of a flight at most.
const STEPS_MAX: usize = 1_000_000;

impl Stepping {
    /// The end of the flight through `problem` by steps of `step` (s); `None` where it takes too many.
    pub(super) fn end(self, problem: &Problem, step: f64) -> Option<State> {
        let step = (self.step)(step);
        let mut now = State::at_impact(problem);
        let slowest = self.rest_speed * now.velocity;
        now.velocity -= self.kick * step * problem.stages[0].force(0.0, now.velocity) / problem.mass;
        let mut before: Option<Stage> = None;
        let mut steps = 0;
        for law in &problem.stages {
            let limit = law.end.min(problem.exit_depth);
            let mut left_over = before.take();
            loop {
                steps += 1;
                if steps > STEPS_MAX {
                    return None;
                }
                let ahead_by = |scheme: Self, part: f64| scheme.ahead(law, left_over, problem.mass, now, part);
                let ahead = |part: f64| ahead_by(self, part);
                let next = ahead(step);
                if next.depth < limit && next.velocity > slowest {
                    (now, left_over) = (next, None);
                    continue;
                }
                let first_by = |scheme: Self, is_past: &dyn Fn(State) -> bool| {
                    let (mut low, mut high) = (0.0, step);
                    for _ in 0..self.halvings {
                        let middle = 0.5 * (low + high);
                        if is_past(ahead_by(scheme, middle)) { high = middle } else { low = middle }
                    }
                    ahead_by(scheme, high)
                };
                let first = |is_past: &dyn Fn(State) -> bool| first_by(self, is_past);
                let rests = next.velocity <= slowest && first(&|state| state.velocity <= slowest).depth < limit;
                let is_exit = !rests && limit == problem.exit_depth;
                let placed = if rests {
                    self.rest
                } else if is_exit {
                    self.exit
                } else {
                    self.stage_end
                };
                let end = match placed {
                    Placed::ByPart if rests => first(&|state| state.velocity <= slowest),
                    Placed::ByPart => first(&|state| state.depth >= limit),
                    Placed::OnChord if rests => on_chord(now, next, |state| -state.velocity, 0.0),
                    Placed::OnChord => on_chord(now, next, |state| state.depth, limit),
                    Placed::OnCubic(factors) => {
                        let slope = |state: State| -law.force(state.depth, state.velocity) / problem.mass;
                        let slopes = [factors[0] * slope(now), factors[1] * slope(next)];
                        let is_past = |state: State| if rests { state.velocity <= 0.0 } else { state.depth >= limit };
                        let (mut low, mut high) = (0.0, 1.0);
                        for _ in 0..self.halvings {
                            let middle = 0.5 * (low + high);
                            if is_past(on_cubic(now, next, slopes, middle)) { high = middle } else { low = middle }
                        }
                        on_cubic(now, next, slopes, high)
                    }
                    Placed::ByMidpoint => {
                        let midpoint = Self { numbers: MIDPOINT, ..self };
                        first_by(midpoint, &|state| if rests { state.velocity <= 0.0 } else { state.depth >= limit })
                    }
                    Placed::AtFirstSpeed => ahead((limit - now.depth) / now.velocity),
                    Placed::AtStepEnd | Placed::AtStepEndByDepth => next,
                };
                let velocity =
                    if is_exit { (self.exit_speed)([now.velocity, end.velocity, next.velocity]) } else { end.velocity };
                now = State {
                    time: now.time + (self.clock)(end.time - now.time, step, rests || is_exit),
                    depth: if rests || placed == Placed::AtStepEnd { end.depth } else { limit },
                    velocity: if rests { 0.0 } else { velocity.max(0.0) },
                };
                if rests || is_exit || now.velocity == 0.0 {
                    return Some(now);
                }
                before = Some(*law);
                break;
            }
        }
        Some(now)
    }

    /// The state a time `h` behind `now` (s).
    fn ahead(self, law: &Stage, left_over: Option<Stage>, mass: f64, now: State, h: f64) -> State {
        let ([a2, a3, a4], [b1, b2, b3, b4]) = self.numbers;
        let (x, v) = (now.depth, now.velocity);
        let a = |dx: f64, dv: f64| -law.force(x + (1.0 - self.lag[0]) * dx, v + (1.0 - self.lag[1]) * dv) / mass;
        let of_before = left_over.map_or(0.0, |law| -law.force(x, v) / mass - a(0.0, 0.0));
        let k1 = [v, a(0.0, 0.0) + self.stale * of_before];
        let behind = |part: f64, [dx, dv]: [f64; 2]| [v + part * h * dv, a(part * h * dx, part * h * dv)];
        let k2 = behind(a2, k1);
        let k3 = behind(a3, k2);
        let k4 = behind(a4, k3);
        let sum = |i: usize| h * (b1 * k1[i] + b2 * k2[i] + b3 * k3[i] + b4 * k4[i]);
        let part = if left_over.is_some() { self.restart } else { 1.0 };
        let velocity = v + part * sum(1);
        let distance = if self.by_mean_speed { 0.5 * h * (v + velocity) } else { sum(0) };
        State { time: now.time + h, depth: x + distance, velocity }
    }
}

/// The state at a `part` of the way from `from` to `to`, on cubics with these slopes of V.
pub(super) fn on_cubic(from: State, to: State, slopes: [f64; 2], part: f64) -> State {
    let step = to.time - from.time;
    let cubic = |[a, b]: [f64; 2], [da, db]: [f64; 2]| {
        let left = 1.0 - part;
        left * left * ((1.0 + 2.0 * part) * a + part * step * da)
            + part * part * ((3.0 - 2.0 * part) * b - left * step * db)
    };
    State {
        time: from.time + part * step,
        depth: cubic([from.depth, to.depth], [from.velocity, to.velocity]),
        velocity: cubic([from.velocity, to.velocity], slopes),
    }
}

/// The state between `from` and `to` at which `of` reaches `limit`, on a straight line.
fn on_chord(from: State, to: State, of: fn(State) -> f64, limit: f64) -> State {
    let part = (limit - of(from)) / (of(to) - of(from));
    let between = |from: f64, to: f64| from + part * (to - from);
    State {
        time: between(from.time, to.time),
        depth: between(from.depth, to.depth),
        velocity: between(from.velocity, to.velocity),
    }
}
