//! Schemes of fixed steps that need more than one slope of a step before, or an iteration within one.

use super::stepping::on_cubic;
use crate::physics::{Problem, Stage, State};

/// Halvings of a step, in which an event is located.
const HALVINGS: usize = 100;
/// Steps of a flight, and iterations within one, at most.
const STEPS_MAX: usize = 1_000_000;
const ITERATIONS_MAX: usize = 100;

/// The weights of Adams and Bashforth's scheme of order 3, the newest first, and of Moulton's, that of the new slope first.
pub(super) const ADAMS: [f64; 3] = [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0];
pub(super) const MOULTON: [f64; 3] = [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0];

/// How a step of so many seconds is made, from the states at its start and at the starts of those before it, the newest first.
#[derive(Clone, Copy)]
pub(super) enum Scheme {
    /// Adams and Bashforth's, with these weights, the newest first, and whether the first two steps are Euler's.
    Adams([f64; 3], bool),
    /// Adams and Moulton's corrector behind Bashforth's of order 3, with these weights, that of the new slope first.
    Corrected([f64; 3]),
    /// Backward differences of order 2, with this weight of the new slope.
    Backward(f64),
    /// The implicit midpoint rule, iterated until V changes by less than this part of it.
    Midpoint(f64),
    /// Gauss's of two slopes, iterated until `h` times what they change is less than this part of V.
    Gauss(f64),
}

fn slope(law: &Stage, mass: f64, at: State) -> [f64; 2] {
    [at.velocity, -law.force(at.depth, at.velocity) / mass]
}

fn ahead(from: State, h: f64, [dx, dv]: [f64; 2]) -> State {
    State { time: from.time + h, depth: from.depth + h * dx, velocity: from.velocity + h * dv }
}

fn classical(law: &Stage, mass: f64, now: State, h: f64) -> State {
    let k1 = slope(law, mass, now);
    let k2 = slope(law, mass, ahead(now, 0.5 * h, k1));
    let k3 = slope(law, mass, ahead(now, 0.5 * h, k2));
    let k4 = slope(law, mass, ahead(now, h, k3));
    ahead(now, h, std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0))
}

fn midpoint(law: &Stage, mass: f64, now: State, h: f64, tolerance: f64) -> State {
    let mut middle = now.velocity;
    for _ in 0..ITERATIONS_MAX {
        let depth = now.depth + 0.5 * h * middle;
        let next = now.velocity - 0.5 * h * law.force(depth, middle) / mass;
        let change = (next - std::mem::replace(&mut middle, next)).abs();
        if change <= tolerance * now.velocity {
            break;
        }
    }
    State { time: now.time + h, depth: now.depth + h * middle, velocity: 2.0 * middle - now.velocity }
}

fn backward(law: &Stage, mass: f64, [now, before]: [State; 2], h: f64, weight: f64) -> State {
    let of_values = |one: f64, other: f64| (4.0 * one - other) / 3.0;
    let from =
        State { depth: of_values(now.depth, before.depth), velocity: of_values(now.velocity, before.velocity), ..now };
    let mut next = now;
    for _ in 0..ITERATIONS_MAX {
        let [dx, dv] = slope(law, mass, next).map(|slope| weight * slope);
        let last = std::mem::replace(&mut next, State { time: now.time + h, ..ahead(from, h, [dx, dv]) });
        if next.velocity == last.velocity && next.depth == last.depth {
            break;
        }
    }
    next
}

fn gauss(law: &Stage, mass: f64, now: State, h: f64, tolerance: f64) -> State {
    let root = 3f64.sqrt() / 6.0;
    let weights = [[0.25, 0.25 - root], [0.25 + root, 0.25]];
    let mut slopes = [slope(law, mass, now); 2];
    let sum = |[b1, b2]: [f64; 2], slopes: &[[f64; 2]; 2]| {
        ahead(now, h, std::array::from_fn(|i| b1 * slopes[0][i] + b2 * slopes[1][i]))
    };
    for _ in 0..ITERATIONS_MAX {
        let next = weights.map(|weights| slope(law, mass, sum(weights, &slopes)));
        let before = std::mem::replace(&mut slopes, next);
        let change = (0..2).map(|stage| (slopes[stage][1] - before[stage][1]).abs()).fold(0.0, f64::max);
        if h * change <= tolerance * now.velocity {
            break;
        }
    }
    sum([0.5, 0.5], &slopes)
}

impl Scheme {
    fn step(self, law: &Stage, mass: f64, states: &[State], h: f64) -> State {
        let now = states[states.len() - 1];
        match self {
            Self::Midpoint(tolerance) => midpoint(law, mass, now, h, tolerance),
            Self::Gauss(tolerance) => gauss(law, mass, now, h, tolerance),
            Self::Corrected([new, rest @ ..]) if states.len() >= 3 => {
                let ahead_by = |weights: &[f64], slopes: &[[f64; 2]]| {
                    let sum = |i| weights.iter().zip(slopes).map(|(weight, slope)| weight * slope[i]).sum();
                    ahead(now, h, std::array::from_fn(sum))
                };
                let slopes: Vec<_> = states.iter().rev().take(3).map(|at| slope(law, mass, *at)).collect();
                let foreseen = ahead_by(&ADAMS, &slopes);
                ahead_by(&[new, rest[0], rest[1]], &[slope(law, mass, foreseen), slopes[0], slopes[1]])
            }
            Self::Backward(weight) if states.len() >= 2 => {
                backward(law, mass, [now, states[states.len() - 2]], h, weight)
            }
            Self::Corrected(_) | Self::Backward(_) => classical(law, mass, now, h),
            Self::Adams(_, true) if states.len() < 3 => ahead(now, h, slope(law, mass, now)),
            Self::Adams(..) if states.len() < 3 => classical(law, mass, now, h),
            Self::Adams(weights, _) => {
                let slopes = || weights.into_iter().zip(states.iter().rev().map(|at| slope(law, mass, *at)));
                ahead(now, h, std::array::from_fn(|i| slopes().map(|(weight, slope)| weight * slope[i]).sum()))
            }
        }
    }

    /// The end of the flight through `problem` by steps of `h` (s), each end of a stage on the cubics of its step; `None` where it takes
    /// too many.
    pub(super) fn end(self, problem: &Problem, h: f64) -> Option<State> {
        let mut now = State::at_impact(problem);
        for law in &problem.stages {
            let limit = law.end.min(problem.exit_depth);
            let mut states = vec![now];
            let end = loop {
                let next = self.step(law, problem.mass, &states, h);
                let from = states[states.len() - 1];
                if next.depth >= limit || next.velocity <= 0.0 {
                    let slopes = [from, next].map(|at| slope(law, problem.mass, at)[1]);
                    let is_past = |at: State| at.depth >= limit || at.velocity <= 0.0;
                    let (mut low, mut high) = (0.0, 1.0);
                    for _ in 0..HALVINGS {
                        let middle = 0.5 * (low + high);
                        if is_past(on_cubic(from, next, slopes, middle)) { high = middle } else { low = middle }
                    }
                    break on_cubic(from, next, slopes, high);
                }
                states.push(next);
                if states.len() > STEPS_MAX {
                    return None;
                }
            };
            if end.velocity <= 0.0 && end.depth < limit {
                return Some(State { velocity: 0.0, ..end });
            }
            now = State { depth: limit, ..end };
            if limit == problem.exit_depth {
                return Some(now);
            }
        }
        Some(now)
    }
}
