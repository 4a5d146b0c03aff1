//! Manufactured solutions: a path is chosen, the force that makes it a solution is added, and the scheme must find it.
//!
//! ```text
//! M x'' = -F(x, x') + S(t),   S(t) = M x_m'' + F(x_m, x_m')
//! ```
//!
//! No event is in play and no closed form is needed, so the order belongs to the steps alone. The path's derivatives
//! come from second-order dual numbers: a chosen formula is the only thing that can be wrong here.
//!
//! # Source
//! docs/theory.md, section 7; P. J. Roache, J. Fluids Eng. 124 (2002) 4-10.

use num_dual::{Dual2_64, DualNum, second_derivative};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Deserialize;

use super::super::claim::Found;
use super::{Subject, orders};
use crate::integrators::CentralDifference;
use crate::physics::{Problem, Stage, State};
use crate::studies::convergence::{Ladder, STEPS_OVER_TIME};
use crate::studies::order::{StepError, fit};

check! {
    /// Central difference on a manufactured solution: distance of the fitted order of its largest distance from the path
    /// at the nodes, over the depth reached, from `order`.
    Manufactured {
        /// `smooth` or `kink`.
        path: ManufacturedPath,
        /// Order expected.
        order: f64,
    } in Orders, "order", by order, compares (Steps | Itself);
}

/// Which manufactured path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ManufacturedPath {
    /// One stage.
    Smooth,
    /// Through x = k d at a known time.
    Kink,
}

/// How many step sizes.
const POINTS: usize = 40;

/// When the path ends (s).
const END: f64 = 1.0;

/// When stage, force and acceleration change on the path with a kink (s): at no simple share of the end.
const KINK: f64 = 0.437;

/// Mass (kg). Every term of the force is of the size of the inertia, so that none can go wrong unseen.
const MASS: f64 = 2.0;

const FIRST: Stage = Stage { static_force: 1.5, stiffness: 4.0, viscosity: 0.7, drag: 1.1, end: f64::INFINITY };

/// Behind the kink: another value of every coefficient.
const SECOND: Stage = Stage { static_force: 3.5, stiffness: 1.0, viscosity: 0.2, drag: 2.3, end: f64::INFINITY };

impl ManufacturedPath {
    /// Times at which the stages end (s).
    fn ends(self) -> &'static [f64] {
        match self {
            Self::Smooth => &[END],
            Self::Kink => &[KINK, END],
        }
    }
}

/// x_m(t) (m) in stage `stage`, its velocity and its acceleration: always forward, at a speed that swings between 0.4
/// and 1.6 m/s.
///
/// Behind the kink a term in (t - t_k)² joins it: x_m' has a kink there and x_m'' a jump, so that a step around it
/// with the acceleration of one side alone shows.
fn path_at(stage: usize, t: f64) -> (f64, f64, f64) {
    let depth = |t: Dual2_64| {
        let path = t + (t * 3.0).sin() * 0.2;
        if stage == 0 { path } else { path + (t - KINK).powi(2) * 0.8 }
    };
    second_derivative(depth, t)
}

/// S(t) (N) in stage `stage`.
fn source(problem: &Problem, stage: usize, t: f64) -> f64 {
    let (x, v, a) = path_at(stage, t);
    problem.mass * a + problem.stages[stage].force(x, v)
}

fn order(&Manufactured { path, order: expected }: &Manufactured, subject: &Subject<'_>) -> Found {
    let (_, impact_speed, _) = path_at(0, 0.0);
    let problem = Problem::of_stages(MASS, impact_speed, [FIRST, SECOND]);
    let ends = path.ends();
    let (amplitude, ..) = path_at(ends.len() - 1, END);
    let error = |size: f64| -> Found<StepError> {
        let states = CentralDifference::uniform(size, subject.velocity(), subject.boundaries()).forced_states(
            &problem,
            |stage, t| source(&problem, stage, t),
            ends,
        )?;
        let off = |state: &State| {
            let stage = ends.iter().take_while(|&&end| end < state.time).count().min(ends.len() - 1);
            state.depth - path_at(stage, state.time).0
        };
        // `f64::max` would drop a NaN.
        let worst = states.iter().map(off).fold(0.0, |a: f64, b| if b.abs() <= a.abs() { a } else { b });
        Ok(StepError::new(size, worst / amplitude))
    };
    let [from, to] = STEPS_OVER_TIME.map(|share| share * END);
    let sizes = Ladder { from, to, points: POINTS, seed: subject.context.seed }.sizes();
    let errors: Vec<StepError> = sizes.into_par_iter().map(error).collect::<Result<_, _>>()?;
    orders::judge(fit(&errors), 0, expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_is_the_one_derived_by_hand() {
        let problem = Problem::of_stages(MASS, 1.6, [FIRST, SECOND]);
        for (stage, t) in [(0, 0.0), (0, 0.3), (1, 0.9)] {
            let bend = if stage == 0 { 0.0 } else { 0.8 };
            let x = t + 0.2 * (3.0 * t).sin() + bend * (t - KINK) * (t - KINK);
            let v = 1.0 + 0.6 * (3.0 * t).cos() + 2.0 * bend * (t - KINK);
            let a = -1.8 * (3.0 * t).sin() + 2.0 * bend;
            let by_hand = MASS * a + problem.stages[stage].force(x, v);
            let error = source(&problem, stage, t) - by_hand;
            assert!(error.abs() < 1e-14 * by_hand.abs().max(1.0), "stage {stage}, t = {t}: {error:e}");
        }
    }

    #[test]
    fn depth_and_velocity_are_continuous_through_the_kink_and_acceleration_and_source_jump() {
        let (before, after) = (path_at(0, KINK), path_at(1, KINK));
        assert_eq!((before.0, before.1), (after.0, after.1));
        assert!((after.2 - before.2 - 1.6).abs() < 1e-14);
    }
}
