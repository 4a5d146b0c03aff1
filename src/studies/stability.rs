//! Where does the central difference become unstable, and how fast does it then grow? Measured against theory.
//!
//! Linear motion with stiffness and drag, `M x'' = -(s x + r x')`, with `a = w dt`, `w² = s/M` and `g = r dt/M`, which
//! for a drag Q V² is `2 Q V dt/M`: one step maps (V(i-1/2), x(i)) by a matrix of trace T and determinant D,
//!
//! ```text
//! lagged:     D = 1 - g                         T = 1 + D - a²
//! centred:    D = (1 - g/2)/(1 + g/2)           T = 1 + D - a²/(1 + g/2)
//! predicted:  D = 1 - g + g²/2                  T = 1 + D - a² (1 - g/2)
//! ```
//!
//! and amplitudes grow by the larger root of `z² - T z + D = 0` a step. The lagged line with g = 0 is `docs/theory.md`, section 5.
//! The formulas are derived here from Eq. 6-8 alone, apart from
//! [`crate::integrators::central_difference::stability_limit`], which states the limit in closed form.

use super::order::{bisect, try_bisect};
use crate::integrators::IntegrationError;
use crate::integrators::central_difference::{Boundaries, CentralDifference, VelocityAt};
use crate::physics::{Problem, Stage, State};

/// Steps of a run that decides whether amplitudes grow. At 1e-3 beyond the limit they grow by e in about 30 steps.
const STEPS: usize = 4000;

/// Growth per step of the linear motion, by theory: the spectral radius of one step.
pub fn growth_in_theory(velocity: VelocityAt, w_dt: f64, drag_dt: f64) -> f64 {
    let (a2, g) = (w_dt * w_dt, drag_dt);
    let (determinant, kick) = match velocity {
        VelocityAt::LaggedHalfStep => (1.0 - g, a2),
        VelocityAt::Centred => ((1.0 - 0.5 * g) / (1.0 + 0.5 * g), a2 / (1.0 + 0.5 * g)),
        VelocityAt::PredictedHalfStep => (1.0 - g + 0.5 * g * g, a2 * (1.0 - 0.5 * g)),
    };
    let half_trace = 0.5 * (1.0 + determinant - kick);
    let discriminant = half_trace * half_trace - determinant;
    if discriminant < 0.0 { determinant.sqrt() } else { half_trace.abs() + discriminant.sqrt() }
}

/// The free linear motion at unit frequency scale: M = 1, dt = 1, so that s = a² and r = g; V0 = 1.
fn states(velocity: VelocityAt, w_dt: f64, drag_dt: f64, count: usize) -> Result<Vec<State>, IntegrationError> {
    let law = Stage { stiffness: w_dt * w_dt, viscosity: drag_dt, ..Stage::free() };
    let motion = Problem::of_stages(1.0, 1.0, [law]);
    CentralDifference::uniform(1.0, velocity, Boundaries::StepEnd).free_states(&motion, count)
}

/// Growth per step, measured: of the largest of depth and velocity, between the second and the last fifth of a run.
///
/// Bounded oscillation gives one to about the inverse of `steps`, in which the linear growth at the limit also lies.
///
/// # Errors
/// As [`CentralDifference::free_states`].
pub fn growth_measured(velocity: VelocityAt, w_dt: f64, drag_dt: f64, steps: usize) -> Result<f64, IntegrationError> {
    let fifth = steps / 5;
    let states = states(velocity, w_dt, drag_dt, steps)?;
    let reach = |from: usize| {
        states[from..from + fifth].iter().map(|s| s.depth.abs().max(s.velocity.abs())).fold(0.0, f64::max)
    };
    Ok((reach(4 * fifth) / reach(fifth)).powf(1.0 / (3 * fifth) as f64))
}

/// One point of the boundary between stable and unstable steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryPoint {
    /// Velocity rule.
    pub velocity: VelocityAt,
    /// Drag group Q V dt/M, half of g.
    pub drag_group: f64,
    /// w dt at which amplitudes begin to grow, measured.
    pub measured: f64,
    /// The same by theory.
    pub theory: f64,
}

/// The stability map: for each velocity rule the w dt at which growth sets in, over the drag group Q V dt/M.
///
/// `count` points of each rule, evenly from no drag to nine tenths of where the drag alone is unstable.
///
/// # Errors
/// As [`CentralDifference::free_states`].
pub fn map(count: usize) -> Result<Vec<BoundaryPoint>, IntegrationError> {
    let mut points = Vec::with_capacity(3 * count);
    for velocity in VelocityAt::ALL {
        for i in 0..count {
            let drag_group = 0.9 * i as f64 / count as f64;
            let g = 2.0 * drag_group;
            // Where growth sets in, between w dt = 0.01 and 20.
            points.push(BoundaryPoint {
                velocity,
                drag_group,
                measured: try_bisect(0.01, 20.0, 50, |a| grows(velocity, a, g).map(|grows| !grows))?,
                theory: bisect(0.01, 20.0, 50, |a| growth_in_theory(velocity, a, g) <= 1.0 + 1e-12),
            });
        }
    }
    Ok(points)
}

/// Whether the later half of a run reaches clearly farther than the earlier.
fn grows(velocity: VelocityAt, w_dt: f64, drag_dt: f64) -> Result<bool, IntegrationError> {
    let states = states(velocity, w_dt, drag_dt, STEPS)?;
    let (early, late) = states.split_at(STEPS / 2);
    let reach = |part: &[State]| part.iter().map(|s| s.depth.abs()).fold(0.0, f64::max);
    // Beyond the range of the numbers there is no ratio: max ignores a NaN, and the last state shows it.
    let overflows = late.last().is_none_or(|s| !s.depth.is_finite());
    Ok(overflows || reach(late) > 1.5 * reach(early))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn growth_without_drag_is_that_of_the_theory_of_the_paper() {
        // z² - (2 - a²) z + 1 = 0 at a = 3: z = (-7 ± sqrt(45))/2.
        let expected = 3.5 + 0.5 * 45f64.sqrt();
        assert!((growth_in_theory(VelocityAt::LaggedHalfStep, 3.0, 0.0) - expected).abs() < 1e-14);
        for velocity in VelocityAt::ALL {
            assert!((growth_measured(velocity, 3.0, 0.0, 100).unwrap() / expected - 1.0).abs() < 1e-9);
            assert!((growth_measured(velocity, 1.0, 0.0, 1000).unwrap() - 1.0).abs() < 1e-3);
        }
    }
}
