//! A Taylor series of the time, and what people get wrong in one.

use crate::physics::{Problem, Stage, State};

/// Terms of the series.
const TERMS: usize = 20;
/// Length of a step over V divided by the deceleration, and the same where the force hardly depends on V: it may then reach rest.
const PART: f64 = 0.2;
const PART_TO_REST: f64 = 1.2;
/// Steps of a flight at most.
const STEPS_MAX: usize = 1000;
/// Halvings of a step, in which its end is located.
const HALVINGS: usize = 60;

/// What may be wrong with a series.
#[derive(Clone, Copy)]
pub(super) struct Series {
    /// A term of V² from those of V up to the same power.
    pub product: fn(&[f64]) -> f64,
    /// What the term of a power of V is multiplied by.
    pub factor: fn(usize) -> f64,
    /// Whether the terms of V² are added to those of the steps before, since the start of the stage.
    pub adds_up: bool,
}

/// The right one.
pub(super) const RIGHT_SERIES: Series =
    Series { product: |v| (0..v.len()).map(|i| v[i] * v[v.len() - 1 - i]).sum(), factor: |_| 1.0, adds_up: false };

impl Series {
    /// The end of the flight through `problem`; `None` where it takes too many steps.
    pub(super) fn end(self, problem: &Problem) -> Option<State> {
        let mut now = State::at_impact(problem);
        for law in &problem.stages {
            now = self.through(law, problem, now)?;
            if now.velocity <= 0.0 || now.depth >= problem.exit_depth {
                break;
            }
        }
        Some(now)
    }

    /// The end of the stage, the exit or rest.
    fn through(self, law: &Stage, problem: &Problem, mut now: State) -> Option<State> {
        let limit = law.end.min(problem.exit_depth);
        let mut squares = [0.0; TERMS];
        for _ in 0..STEPS_MAX {
            let (depths, speeds) = self.terms(law, problem.mass, now, &mut squares);
            let at = |h: f64| {
                let of = |terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| sum * h + term);
                State { time: now.time + h, depth: of(&depths), velocity: of(&speeds) }
            };
            let to_limit = 1.5 * (limit - now.depth) / now.velocity;
            let by_speed =
                now.velocity * (law.viscosity + law.drag * now.velocity) / law.force(now.depth, now.velocity);
            let part = (PART / by_speed.abs()).clamp(PART, PART_TO_REST);
            let slowest = now.velocity.max(0.1 * problem.impact_speed);
            let step = to_limit.min(part * slowest / speeds[1].abs());
            let is_past = |state: State| state.velocity <= 0.0 || state.depth >= limit;
            if !is_past(at(step)) {
                now = at(step);
                continue;
            }
            let (mut low, mut high) = (0.0, step);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if is_past(at(middle)) { high = middle } else { low = middle }
            }
            let end = at(high);
            let is_through = end.depth >= limit;
            return Some(State {
                depth: if is_through { limit } else { end.depth },
                velocity: if is_through { end.velocity.max(0.0) } else { 0.0 },
                ..end
            });
        }
        None
    }

    /// Terms of depth and velocity; `squares` are those of V² so far.
    fn terms(
        self,
        law: &Stage,
        mass: f64,
        State { depth, velocity, .. }: State,
        squares: &mut [f64; TERMS],
    ) -> (Vec<f64>, Vec<f64>) {
        let (mut x, mut v) = (vec![depth], vec![velocity]);
        for power in 1..=TERMS {
            let [distance, speed] = [x[power - 1], v[power - 1]];
            let steady = if power == 1 { law.static_force } else { 0.0 };
            let square = &mut squares[power - 1];
            *square = (self.product)(&v) + if self.adds_up { *square } else { 0.0 };
            let force = steady + law.stiffness * distance + law.viscosity * speed + law.drag * *square;
            x.push(speed / power as f64);
            v.push(-force / mass / power as f64 * (self.factor)(power));
        }
        (x, v)
    }
}
