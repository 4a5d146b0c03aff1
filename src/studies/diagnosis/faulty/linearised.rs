//! A scheme of fixed steps of order 2: half a step of x at one V, a step of V with a force that is linear in V, and the other half of x.

use crate::physics::{Problem, Stage, State};

/// Halvings of a step, in which an event is located.
const HALVINGS: usize = 100;
/// Steps of a flight at most.
const STEPS_MAX: usize = 1_000_000;

/// The linear part of the force.
#[derive(Clone, Copy)]
pub(super) enum Linear {
    /// The derivative at V, which is right, times a factor.
    Times(f64),
    /// That without drag.
    WithoutDrag,
    /// That at the start of the stage.
    OfStageStart,
    /// The right one, of a force without p and s x, which are applied before.
    OneByOne,
}

impl Linear {
    fn ahead(self, law: &Stage, mass: f64, now: State, entry_speed: f64, h: f64) -> State {
        let middle = now.depth + 0.5 * h * now.velocity;
        let derivative = |v: f64| -(law.viscosity + 2.0 * law.drag * v) / mass;
        let (pushed, law) = match self {
            Self::OneByOne => {
                let steady = Stage { viscosity: 0.0, drag: 0.0, ..*law };
                let pushed = now.velocity - h * steady.force(middle, now.velocity) / mass;
                (pushed, Stage { static_force: 0.0, stiffness: 0.0, ..*law })
            }
            _ => (now.velocity, *law),
        };
        let rate = match self {
            Self::Times(factor) => factor * derivative(pushed),
            Self::WithoutDrag => -law.viscosity / mass,
            Self::OfStageStart => derivative(entry_speed),
            Self::OneByOne => derivative(pushed),
        };
        let over = if rate == 0.0 { h } else { (rate * h).exp_m1() / rate };
        let velocity = pushed - over * law.force(middle, pushed) / mass;
        State { time: now.time + h, depth: middle + 0.5 * h * velocity, velocity }
    }

    /// The end of the flight through `problem` by steps of `h` (s), each end of a stage by a part of one; `None` where it takes too many.
    pub(super) fn end(self, problem: &Problem, h: f64) -> Option<State> {
        let mut now = State::at_impact(problem);
        for law in &problem.stages {
            let limit = law.end.min(problem.exit_depth);
            let entry_speed = now.velocity;
            let ahead = |now: State, part: f64| self.ahead(law, problem.mass, now, entry_speed, part);
            let is_past = |at: State| at.depth >= limit || at.velocity <= 0.0;
            let inside = std::iter::successors(Some(now), |at| Some(ahead(*at, h)).filter(|next| !is_past(*next)));
            let last = inside.take(STEPS_MAX).last()?;
            let (mut low, mut high) = (0.0, h);
            for _ in 0..HALVINGS {
                let part = 0.5 * (low + high);
                if is_past(ahead(last, part)) { high = part } else { low = part }
            }
            now = ahead(last, high);
            if now.depth < limit {
                return (now.velocity <= 0.0).then_some(State { velocity: 0.0, ..now });
            }
            now.depth = limit;
            if limit == problem.exit_depth {
                return Some(now);
            }
        }
        Some(now)
    }
}

/// How the end of a stage is passed by the scheme with the right linear part.
#[derive(Clone, Copy)]
pub(super) enum Passing {
    /// By a step that is taken whole.
    Whole,
    /// By a step that ends there, but for the one that reaches the exit.
    WholeAtExit,
}

impl Passing {
    /// The end of the flight through `problem` by steps of `h` (s), exit and rest by a part of one; `None` where it takes too many.
    pub(super) fn end(self, problem: &Problem, h: f64) -> Option<State> {
        let mut now = State::at_impact(problem);
        for _ in 0..STEPS_MAX {
            let law = problem.stages.iter().find(|law| now.depth < law.end)?;
            let ahead = |part: f64| Linear::Times(1.0).ahead(law, problem.mass, now, now.velocity, part);
            let first = |is_past: &dyn Fn(State) -> bool| {
                let (mut low, mut high) = (0.0, h);
                for _ in 0..HALVINGS {
                    let part = 0.5 * (low + high);
                    if is_past(ahead(part)) { high = part } else { low = part }
                }
                ahead(high)
            };
            let next = ahead(h);
            let is_end = |at: State| at.depth >= problem.exit_depth || at.velocity <= 0.0;
            if is_end(next) {
                let end = first(&is_end);
                let is_exit = end.depth >= problem.exit_depth;
                return Some(if is_exit {
                    State { depth: problem.exit_depth, ..end }
                } else {
                    State { velocity: 0.0, ..end }
                });
            }
            now = match self {
                Self::WholeAtExit if next.depth >= law.end => {
                    State { depth: law.end, ..first(&|at| at.depth >= law.end) }
                }
                _ => next,
            };
        }
        None
    }
}
