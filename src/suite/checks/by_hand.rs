//! The central difference beside a plain loop over the same steps, with each velocity and boundary rule.

use super::super::claim::{Found, Measurement, NotMeasured};
use super::problems::{in_double_double, problems};
use super::{Subject, Worst, off};
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, Integrator, Steps, VelocityAt};
use crate::physics::{EventKind, Outcome, Problem, Stage, State};
use crate::studies::random_problems::Kind;

check! {
    /// The claim's rules of the central difference on random problems of every kind against Eq. 6-8 in a plain loop, at a
    /// step of a few hundredth of the flight and at the default one: each row of the path with its force, each event, the
    /// outcome, the work and the stated limit of the step; worst difference.
    StepsByHand {
        /// How many problems of each kind.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
    } in Steps, "relative", by steps_by_hand, compares (Steps | Itself);
}

const KINDS: [Kind; 7] =
    [Kind::Crater, Kind::Tunnel, Kind::SpringAndDrag, Kind::Viscous, Kind::ViscousSpring, Kind::Driven, Kind::Several];

/// A row of the path: state, force (N), stage.
type Row = (State, f64, usize);

/// What the plain loop finds.
#[derive(Default)]
struct ByHand {
    rows: Vec<Row>,
    events: Vec<(EventKind, State)>,
    steps: u64,
    evaluations: u64,
    step_limit: f64,
    is_through: bool,
}

/// Eq. 6-8 with equal steps of `dt` (s).
struct Loop<'a> {
    problem: &'a Problem,
    dt: f64,
    velocity: VelocityAt,
    boundaries: Boundaries,
}

impl Loop<'_> {
    fn force(&self, stage: usize, x: f64, v: f64) -> f64 {
        let Stage { static_force: p, stiffness: s, viscosity: r, drag: q, .. } = self.problem.stages[stage];
        p + s * x + r * v + q * v * v
    }

    /// V(i) from V(i-1/2) = `u` half a step `half` before, at `x`; and the deceleration there.
    fn arrive(&self, stage: usize, x: f64, u: f64, half: f64) -> (f64, f64) {
        let mass = self.problem.mass;
        let force = |v: f64| self.force(stage, x, v) / mass;
        let d = match self.velocity {
            VelocityAt::LaggedHalfStep => force(u),
            VelocityAt::PredictedHalfStep => force(u - half * force(u)),
            VelocityAt::Centred => {
                // v + half F(x, v)/M = u by Newton's method.
                let Stage { viscosity, drag, .. } = self.problem.stages[stage];
                let mut v = u;
                for _ in 0..60 {
                    let slope = 1.0 + half * (viscosity + 2.0 * drag * v) / mass;
                    v -= (v + half * force(v) - u) / slope;
                }
                force(v)
            }
        };
        (u - half * d, d)
    }

    /// The stage that holds at `x`, not before `from`.
    fn stage_at(&self, from: usize, x: f64) -> usize {
        let mut stage = from;
        while self.problem.stages[stage].end <= x && self.problem.stages[stage].end < self.problem.exit_depth {
            stage += 1;
        }
        stage
    }

    /// The largest stable step in `stage` at `speed`, but for the predicted velocity: its limit is the first root of a cubic,
    /// which `stability-map` finds.
    fn limit(&self, stage: usize, speed: f64) -> f64 {
        let Stage { stiffness, viscosity, drag, .. } = self.problem.stages[stage];
        let mass = self.problem.mass;
        let w = (stiffness / mass).sqrt();
        let g = match self.velocity {
            VelocityAt::LaggedHalfStep => (viscosity + 2.0 * drag * speed) / mass,
            VelocityAt::Centred => 0.0,
            VelocityAt::PredictedHalfStep => return f64::INFINITY,
        };
        if w.max(g) == 0.0 {
            return f64::INFINITY;
        }
        let (mut low, mut high) = (0.0, 4.0 / w.max(g));
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if w * middle * w * middle + 2.0 * g * middle < 4.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// `None` where a parabola touches a boundary in a step that comes to rest: rounding decides there.
    #[expect(clippy::too_many_lines, reason = "one loop, in plain form: what it shares with the scheme is Eq. 6-8")]
    fn run(&self) -> Option<ByHand> {
        let Self { problem, dt, .. } = *self;
        let exit = problem.exit_depth;
        let mut found = ByHand { step_limit: f64::INFINITY, ..ByHand::default() };
        let each = if self.velocity == VelocityAt::PredictedHalfStep { 2 } else { 1 };
        let is_located = self.boundaries != Boundaries::StepEnd;
        let (mut stage, mut x, mut v) = (0, 0.0, problem.impact_speed);
        let (mut since, mut count) = (0.0, 0.0);
        let mut d = self.force(stage, x, v) / problem.mass;
        let (mut u, mut before) = (v + 0.5 * dt * d, dt);
        let mut fastest = vec![0.0_f64; problem.stages.len()];
        found.evaluations = 1;
        for _ in 0..20_000 {
            let time = since + count * dt;
            found.rows.push((State { time, depth: x, velocity: v }, d * problem.mass, stage));
            fastest[stage] = fastest[stage].max(v);
            let first = stage;
            let end = problem.stages[stage].end;
            let (mut h, mut next_u) = (dt, u - 0.5 * (before + dt) * d);
            let mut next_x = x + dt * next_u;
            let lands = self.boundaries == Boundaries::Landed && end < exit && next_x >= end;
            let place = |depth: f64| 2.0 * (depth - x) / (v + (v * v - 2.0 * d * (depth - x)).sqrt());
            if lands {
                h = place(end).min(dt);
                next_u = u - 0.5 * (before + h) * d;
                next_x = end;
            } else {
                stage = self.stage_at(stage, next_x);
            }
            let (next_v, next_d) = self.arrive(stage, next_x, next_u, 0.5 * h);
            found.evaluations += each;
            found.steps += 1;
            if lands {
                if next_v <= 0.0 {
                    return None;
                }
                (since, count) = (time + h, 0.0);
                let state = State { time: since, depth: end, velocity: next_v };
                stage = self.stage_at(stage, end);
                for passed in first..stage {
                    found.rows.push((state, self.force(passed, end, next_v), passed));
                    found.events.push((EventKind::boundary(problem, passed), state));
                }
                (x, v, before) = (end, next_v, dt);
                d = self.force(stage, x, v) / problem.mass;
                u = v + 0.5 * dt * d;
                found.evaluations += 1;
                continue;
            }
            count += 1.0;
            let arrival = State { time: since + count * dt, depth: next_x, velocity: next_v.max(0.0) };
            let rest = (next_v <= 0.0).then(|| h * v / (v - next_v));
            let last = rest.unwrap_or(h);
            let deepest = if rest.is_some() { x + v * last - 0.5 * d * last * last } else { next_x };
            let passing = |depth: f64| -> Option<State> {
                if !is_located {
                    return (depth <= next_x).then_some(arrival);
                }
                let after = place(depth).min(last);
                let velocity = (v + after / h * (next_v - v)).max(0.0);
                (depth <= deepest).then_some(State { time: time + after, depth, velocity })
            };
            // Touched, but not with certainty.
            let touches = |depth: f64| rest.is_some() && depth > x && depth < x + 0.5 * v * v / d && is_located;
            for passed in first..problem.stages.len() {
                let depth = problem.stages[passed].end;
                if depth > exit {
                    break;
                }
                let Some(state) = passing(depth) else { break };
                if touches(depth) {
                    return None;
                }
                found.rows.push((state, self.force(passed, state.depth, state.velocity), passed));
                found.events.push((EventKind::boundary(problem, passed), state));
            }
            if touches(exit) || touches(end) {
                return None;
            }
            if let Some(state) = passing(exit) {
                found.is_through = true;
                found.events.push((EventKind::Exit, state));
                found.rows.push((state, self.force(stage, state.depth, state.velocity), stage));
                if state.velocity > 0.0 {
                    break;
                }
            }
            if let Some(after) = rest {
                let state = if is_located {
                    State { time: time + after, depth: deepest, velocity: 0.0 }
                } else {
                    State { time: arrival.time, depth: x.max(next_x), velocity: 0.0 }
                };
                let state = found.events.last().filter(|_| found.is_through).map_or(state, |event| event.1);
                found.events.push((EventKind::Rest, state));
                found.rows.push((state, self.force(stage, state.depth, 0.0), stage));
                break;
            }
            (x, v, u, d, before) = (next_x, next_v, next_u, next_d, h);
        }
        for (stage, speed) in fastest.into_iter().enumerate().filter(|(_, speed)| *speed > 0.0) {
            found.step_limit = found.step_limit.min(self.limit(stage, speed));
        }
        Some(found)
    }

    /// The default step by its definition.
    fn default_step(&self) -> f64 {
        let Problem { mass, impact_speed: v0, exit_depth, .. } = *self.problem;
        let (mut shortest, mut longest, mut limit) = (f64::INFINITY, 0.0_f64, f64::INFINITY);
        for (index, stage) in self.problem.stages.iter().enumerate() {
            let Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end } = *stage;
            let (from, to) = (self.problem.start_of(index), end.min(exit_depth));
            if from >= to {
                continue;
            }
            let swing = if s > 0.0 { (mass / s).sqrt() } else { f64::INFINITY };
            // A spring is not compressed farther than V0/w beyond its start.
            let far = if s > 0.0 { to.min(from + v0 * swing) } else { from };
            let greatest = (p + s * from).abs().max((p + s * far).abs());
            let times = [(to - from) / v0, swing, mass * v0 / greatest, mass / r, mass / (q * v0)];
            shortest = times.into_iter().fold(shortest, f64::min);
            let drag_and_force = (mass / (p.abs() * q)).sqrt();
            let slowest = [(to - from) / v0, swing, mass * v0 / p.abs(), drag_and_force]
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            longest = longest.max(slowest);
            limit = limit.min(self.limit(index, v0));
        }
        (shortest / 1e3).max(longest / 1e6).min(limit / 4.0)
    }
}

fn steps_by_hand(&StepsByHand { count }: &StepsByHand, subject: &Subject<'_>) -> Found {
    let mut worst = Worst::default();
    let (mut judged, mut rows) = (0, 0);
    let mut random = subject.random("steps by hand");
    for kind in KINDS {
        for (index, problem) in problems(subject, kind, count)?.iter().enumerate() {
            let name = || format!("in problem {index} of {kind:?}, {problem:?}");
            let (velocity, boundaries) = (subject.velocity(), subject.boundaries());
            let duration = in_double_double(problem)?.end.time.hi();
            let dt = duration * random.log_uniform(2e-3, 1e-2);
            let scheme = CentralDifference::uniform(dt, velocity, boundaries);
            let plain = Loop { problem, dt, velocity, boundaries };
            let by_default = CentralDifference { steps: Steps::Default, ..scheme.clone() };
            if kind != Kind::Several {
                worst.take(off(by_default.time_step(problem), plain.default_step()), name);
            }
            let Some(found) = plain.run() else { continue };
            let flight = scheme.solve(problem, Detail::Trajectory)?;
            rows += found.rows.len();
            judged += 1;
            worst.take(difference(problem, &flight, &found, dt)?, name);
        }
    }
    holds!(2 * judged > KINDS.len() * count, "only {judged} problems are judged");
    let found = worst.measurement();
    let remark = format!("{judged} problems, {rows} rows; {}", found.remark);
    Ok(Measurement::new(found.value).remark(remark).cases(judged))
}

/// Largest difference of what the scheme and the plain loop found.
fn difference(problem: &Problem, flight: &Flight, found: &ByHand, dt: f64) -> Found<f64> {
    let broken = |what: String| Err(NotMeasured::broken(format!("{what}, of {problem:?} at {dt:e} s")));
    let kinds: Vec<_> = flight.events.iter().map(|event| event.kind).collect();
    let right: Vec<_> = found.events.iter().map(|event| event.0).collect();
    if kinds != right {
        return broken(format!("{kinds:?} in place of {right:?}"));
    }
    if (flight.outcome == Outcome::Perforated) != found.is_through || flight.trajectory.len() != found.rows.len() {
        return broken(format!("{} after {} rows, not {}", flight.outcome, flight.trajectory.len(), found.rows.len()));
    }
    if (flight.cost.steps, flight.cost.force_evaluations) != (found.steps, found.evaluations) {
        return broken(format!("{:?}, not {} steps and {} evaluations", flight.cost, found.steps, found.evaluations));
    }
    let limit = flight.step_limit.ok_or_else(|| NotMeasured::broken("no limit of the step"))?;
    if limit.stable != (dt < found.step_limit.min(limit.limit)) {
        return broken(format!("{limit:?}, by hand {:e}", found.step_limit));
    }
    let mut worst = Worst::default();
    if found.step_limit.is_finite() {
        worst.take(off(limit.limit, found.step_limit), || "limit".to_owned());
    }
    let events = flight.events.iter().map(|event| event.state).zip(found.events.iter().map(|event| event.1));
    let states = flight.trajectory.iter().map(|row| row.state).zip(found.rows.iter().map(|row| row.0));
    let end = (flight.end, found.events.last().map_or(flight.end, |event| event.1));
    let [time, depth] = [flight.end.time, flight.end.depth];
    let speed = flight.trajectory.iter().map(|row| row.state.velocity).fold(problem.impact_speed, f64::max);
    for (a, b) in events.chain(states).chain([end]) {
        let differences = [(a.time - b.time) / time, (a.depth - b.depth) / depth, (a.velocity - b.velocity) / speed];
        for difference in differences {
            worst.take(difference.abs(), String::new);
        }
    }
    let mean = problem.mass * problem.impact_speed * problem.impact_speed / depth;
    let greatest = found.rows.iter().map(|row| row.1.abs()).fold(mean, f64::max);
    for (row, (_, force, stage)) in flight.trajectory.iter().zip(&found.rows) {
        if row.stage != *stage {
            return broken(format!("a row at {} is of stage {}, not {stage}", row.state, row.stage));
        }
        worst.take((row.force - force).abs() / greatest, String::new);
    }
    Ok(worst.value)
}
