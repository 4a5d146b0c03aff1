//! diffsol as its user would write it: roots given to the library, one solver kept, the law in a `Cell`.

use std::cell::Cell;

use diffsol::{
    NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverState,
    OdeSolverStopReason, Tableau,
};

use crate::reduced::{Law, Node, Reduced, StageEnd};

type Matrix = NalgebraMat<f64>;
type Pair = NalgebraVec<f64>;
type Factors = NalgebraLU<f64>;

/// What the closures read.
#[derive(Default)]
struct Now {
    law: Cell<Law>,
    distance: Cell<f64>,
    speed: Cell<f64>,
}

impl Now {
    #[inline]
    fn rate(&self, y: &[f64], dy: &mut [f64]) {
        (dy[0], dy[1]) = (y[1], self.law.get().rate(y[0], y[1]));
    }

    fn product(&self, y: &[f64], v: &[f64], jv: &mut [f64]) {
        let law = self.law.get();
        (jv[0], jv[1]) = (v[1], -(law.s * v[0] + (law.r + 2.0 * law.q * y[1]) * v[1]));
    }

    #[inline]
    fn roots(&self, y: &[f64], g: &mut [f64]) {
        (g[0], g[1]) = (y[0] - self.distance.get(), y[1]);
    }
}

/// Hands what solves stages with `tsit45` to `work`.
pub fn with_tsit45<R>(rtol: f64, work: impl FnOnce(&mut dyn FnMut(&Reduced) -> Result<StageEnd, String>) -> R) -> R {
    let now = Now::default();
    let problem = OdeBuilder::<Matrix>::new()
        .rtol(rtol)
        .atol([rtol])
        .rhs(|y, _p, _t, dy| now.rate(y, dy))
        .init(|_p, _t, y| (y[0], y[1]) = (0.0, now.speed.get()), 2)
        .root(|y, _p, _t, g| now.roots(y, g), 2)
        .build()
        .expect("a problem that diffsol takes");
    let tableau = Tableau::<f64>::tsit45();
    let mut kept = None;
    work(&mut |stage| {
        now.law.set(stage.law);
        now.distance.set(stage.distance);
        now.speed.set(stage.speed);
        let h = 0.5 * rtol.powf(1.0 / 6.0);
        let mut solver = match kept.take() {
            Some(solver) => solver,
            None => {
                let mut state = problem.rk_state(&tableau).map_err(|error| error.to_string())?;
                *state.as_mut().h = h;
                problem.tsit45_solver(state).map_err(|error| error.to_string())?
            }
        };
        let state = solver.state_mut();
        (state.y[0], state.y[1]) = (0.0, stage.speed);
        (state.dy[0], state.dy[1]) = (stage.speed, stage.law.rate(0.0, stage.speed));
        (*state.t, *state.h) = (0.0, h);
        let end = run(stage, &mut solver);
        kept = Some(solver);
        end
    })
}

/// Hands what solves stages with `bdf` to `work`: a solver a stage, since Newton failures and Jacobians outlive one.
pub fn with_bdf<R>(rtol: f64, work: impl FnOnce(&mut dyn FnMut(&Reduced) -> Result<StageEnd, String>) -> R) -> R {
    let now = Now::default();
    let problem = OdeBuilder::<Matrix>::new()
        .rtol(rtol)
        .atol([rtol])
        .rhs_implicit(|y, _p, _t, dy| now.rate(y, dy), |y, _p, _t, v, jv| now.product(y, v, jv))
        .init(|_p, _t, y| (y[0], y[1]) = (0.0, now.speed.get()), 2)
        .root(|y, _p, _t, g| now.roots(y, g), 2)
        .build()
        .expect("a problem that diffsol takes");
    work(&mut |stage| {
        now.law.set(stage.law);
        now.distance.set(stage.distance);
        now.speed.set(stage.speed);
        let mut state = problem.bdf_state::<Factors>().map_err(|error| error.to_string())?;
        let fastest = (stage.law.r + 2.0 * stage.law.q).max(1.0);
        *state.as_mut().h = 0.5 * rtol.sqrt() / fastest;
        let mut solver = problem.bdf_solver::<Factors>(state).map_err(|error| error.to_string())?;
        run(stage, &mut solver)
    })
}

fn run<'a, Eqn, S>(stage: &Reduced, solver: &mut S) -> Result<StageEnd, String>
where
    Eqn: OdeEquations<T = f64, V = Pair> + 'a,
    S: OdeSolverMethod<'a, Eqn>,
{
    let longest = stage.law.longest_step();
    let mut before = 0.0;
    for _ in 0..1_000_000 {
        match solver.step().map_err(|error| error.to_string())? {
            OdeSolverStopReason::RootFound(time, index) => {
                let y = solver.interpolate(time).map_err(|error| error.to_string())?;
                let at = Node { time, xi: y[0], u: y[1].max(0.0) };
                if index == 0 {
                    return Ok(StageEnd { at, rests: false });
                }
                if at.xi < stage.distance {
                    return Ok(StageEnd { at: Node { u: 0.0, ..at }, rests: true });
                }
                // Crossed and not seen: between the start of the step and rest.
                let (mut low, mut high) = (before, time);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    let xi = solver.interpolate(middle).map_err(|error| error.to_string())?[0];
                    if xi < stage.distance { low = middle } else { high = middle }
                }
                let y = solver.interpolate(high).map_err(|error| error.to_string())?;
                let u = y[1].max(0.0);
                return Ok(StageEnd { at: Node { time: high, xi: stage.distance, u }, rests: false });
            }
            OdeSolverStopReason::InternalTimestep => {
                let state = solver.state();
                let node = Node { time: state.t, xi: state.y[0], u: state.y[1] };
                // An explicit method accepts NaN here.
                if !node.is_finite() {
                    return Err("a number is not finite".to_owned());
                }
                if node.is_past(stage) {
                    return Err("an event was passed unseen".to_owned());
                }
                before = node.time;
                if state.h > longest {
                    *solver.state_mut().h = longest;
                }
            }
            OdeSolverStopReason::TstopReached => return Err("no event".to_owned()),
        }
    }
    Err("too many steps".to_owned())
}
