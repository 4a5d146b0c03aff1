//! Forward sensitivities of one stage by the crate `diffsol`: with the adapter [`super::diffsol`] the only files that
//! name the crate.
//!
//! The stage is in units of its own (see the adapter):
//!
//! ```text
//! du/dtau = -(a + b xi + r u + q u²),  dxi/dtau = u,  xi(0) = 0,  u(0) = u0
//! ```
//!
//! The library integrates `d(xi, u)/d(a, b, r, q, u0)` beside the state, at fixed time. The caller adds the movement of
//! events with the parameter and starts each stage anew: `ds/dtau` jumps where the law changes.

use diffsol::{DiffsolError, MatrixCommon, NalgebraMat, OdeBuilder, SensitivitiesOdeSolverMethod};
use num_dual::Dual64;

use super::outcome::{IntegrationError, Solved};
use crate::physics::State;

/// `[xi, u]` at `tau = 1` of the stage with the numbers `law = [a, b, r, q, u0]`, with the derivatives at fixed time.
///
/// By Tsitouras 5(4) with relative and absolute tolerance `rtol`.
///
/// # Errors
/// [`IntegrationError::SolverFailed`].
pub fn cross_stage(law: [Dual64; 5], rtol: f64) -> Solved<[Dual64; 2]> {
    let failed = |cause: DiffsolError| IntegrationError::SolverFailed {
        method: "tsit45",
        cause: cause.to_string(),
        last: State { time: 0.0, depth: 0.0, velocity: law[4].re },
    };
    let problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(rtol)
        .atol([rtol])
        .sens_rtol(rtol)
        .sens_atol([rtol])
        .p(law.map(|number| number.re))
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
        .build()
        .map_err(failed)?;
    let mut solver = problem.tsit45_sens().map_err(failed)?;
    let (states, sensitivities, _) = solver.solve_dense_sensitivities(&[1.0]).map_err(failed)?;
    let last = |matrix: &NalgebraMat<f64>, row| matrix[(row, matrix.ncols() - 1)];
    Ok([0, 1].map(|row| {
        // The chain rule from the five numbers to the parameter.
        let slope = law.iter().zip(&sensitivities).map(|(number, by)| number.eps * last(by, row)).sum();
        Dual64::new(last(&states, row), slope)
    }))
}
