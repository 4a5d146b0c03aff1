//! Forward sensitivities of one leg of a flight by the crate `diffsol`: the second half of the adapter
//! [`super::diffsol`], and with it the only place that names the crate.
//!
//! A leg is one stage in its own units (see the adapter), with five numbers that it depends on:
//!
//! ```text
//! du/dtau = -(a + b xi + r u + q u²),  dxi/dtau = u,  xi(0) = 0,  u(0) = u0
//! ```
//!
//! The library integrates `d(xi, u)/d(a, b, r, q, u0)` beside the state, at fixed time. That an event moves with a
//! parameter, and that the law changes there, is for the caller: each leg is a problem of its own, so that `ds/dtau`
//! is computed anew behind a kink and never carried over it.

use diffsol::{DiffsolError, MatrixCommon, NalgebraMat, OdeBuilder, SensitivitiesOdeSolverMethod};

use super::outcome::IntegrationError;
use crate::physics::State;

/// The law of a leg in its own units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegLaw<S = f64> {
    /// Static force at the start of the leg.
    pub steady: S,
    /// Stiffness.
    pub growing: S,
    /// Viscosity.
    pub viscosity: S,
    /// Drag.
    pub drag: S,
    /// Velocity at the start, of V0.
    pub velocity: S,
}

/// State after a leg, and its derivatives at fixed time in the order of [`LegLaw`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegEnd {
    /// Way xi and velocity u.
    pub state: [f64; 2],
    /// Derivatives of both with respect to each of the five numbers.
    pub derivatives: [[f64; 2]; 5],
}

/// Integrates a leg for `duration` with relative and absolute tolerance `rtol`, by Tsitouras 5(4).
///
/// # Errors
/// [`IntegrationError::SolverFailed`].
pub fn fly_leg(law: LegLaw, duration: f64, rtol: f64) -> Result<LegEnd, IntegrationError> {
    integrate(law, duration, rtol).map_err(|cause| IntegrationError::SolverFailed {
        method: "tsit45",
        cause: cause.to_string(),
        last: State { time: 0.0, depth: 0.0, velocity: law.velocity },
    })
}

fn integrate(law: LegLaw, duration: f64, rtol: f64) -> Result<LegEnd, DiffsolError> {
    let problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(rtol)
        .atol([rtol])
        .sens_rtol(rtol)
        .sens_atol([rtol])
        .p([law.steady, law.growing, law.viscosity, law.drag, law.velocity])
        .rhs_sens_implicit(
            |y, p, _t, dy| {
                dy[0] = y[1];
                dy[1] = -(p[0] + p[1] * y[0] + (p[2] + p[3] * y[1]) * y[1]);
            },
            |y, p, _t, v, jv| {
                jv[0] = v[1];
                jv[1] = -(p[1] * v[0] + (p[2] + 2.0 * p[3] * y[1]) * v[1]);
            },
            |y, _p, _t, v, sv| {
                sv[0] = 0.0;
                sv[1] = -(v[0] + v[1] * y[0] + (v[2] + v[3] * y[1]) * y[1]);
            },
        )
        .init_sens(
            |p, _t, y| {
                y[0] = 0.0;
                y[1] = p[4];
            },
            |_p, _t, v, y| {
                y[0] = 0.0;
                y[1] = v[4];
            },
            2,
        )
        .build()?;
    let (states, sensitivities, _) = problem.tsit45_sens()?.solve_dense_sensitivities(&[duration])?;
    let last = |matrix: &NalgebraMat<f64>| [matrix[(0, matrix.ncols() - 1)], matrix[(1, matrix.ncols() - 1)]];
    let mut derivatives = [[0.0; 2]; 5];
    for (ours, theirs) in derivatives.iter_mut().zip(&sensitivities) {
        *ours = last(theirs);
    }
    Ok(LegEnd { state: last(&states), derivatives })
}
