//! The exit margin: how much energy is left at the exit depth, continued below zero for a stop.
//!
//! With `W = V²` the equation of motion reads `dW/dx = -2 F/M`. For `r = 0` it is linear in W and goes on smoothly
//! through `W < 0`, so `W(exit)` is one affine function of `V0²` for stops and perforations alike; its root is the
//! critical velocity, and its sign decides the outcome (theory section 6). Across a stage with `r > 0` a stop is
//! continued by minus twice the static work per mass.
//!
//! A target may hold a barrier and drive the projectile beyond it. Then the least W over the path decides, and it
//! stands at a stage end: inside a stage with `s >= 0` the velocity has a maximum but no minimum. The margin is
//! therefore the least W over the stage ends ahead and the exit; for a target that only resists that is W(exit).

use super::event::{Event, EventKind, Outcome, State};
use super::scalar::Scalar;
use super::stage::{Problem, Stage};

/// `expm1(z)/z`, 1 at zero.
pub(crate) fn expm1_over(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { z.exp_m1() / z }
}

/// `(1 + z/8)^8`, which is below `e^z` for z > 0, by 6 % at z = 1; a bound in four multiplications.
#[inline(always)]
pub(crate) fn exp_from_below(z: f64) -> f64 {
    let root = 1.0 + 0.125 * z;
    let fourth = (root * root) * (root * root);
    fourth * fourth
}

/// `(y + expm1(-y))/y²`, 1/2 at zero.
///
/// Below |y| = 0.3 by its Taylor series, whose first neglected term is under 1e-18; above, the subtraction costs at
/// most four bits.
pub(crate) fn second_exponential_integral(y: f64) -> f64 {
    if y.abs() < 0.3 {
        // sum over n >= 0 of (-y)^n / (n + 2)!
        let mut sum = 0.0;
        for n in (0..14_u32).rev() {
            sum = (1.0 - y * sum) / f64::from(fault!("exit-energy-series", n + 2, n + 3));
        }
        // The loop nests 1/(2)(1 - y/3 (1 - y/4 (...))).
        sum
    } else {
        (y + (-y).exp_m1()) / (y * y)
    }
}

/// W = V² at depth `to` [m²/s²], carried from `w` at depth `from` through one stage by the law without viscosity:
///
/// ```text
/// W(to) = W e^{-y} - (2 xi/M) ((p + s from) E(-y) + s xi (y + expm1(-y))/y²),  y = 2 q xi/M,  xi = to - from
/// ```
///
/// with `E(z) = expm1(z)/z`. Exact for r = 0, of either sign of W.
pub fn carry(stage: &Stage, mass: f64, w: f64, from: f64, to: f64) -> f64 {
    let xi = to - from;
    let y = 2.0 * stage.drag * xi / mass;
    let static_at_start = stage.static_force + stage.stiffness * from;
    w * fault!("exit-energy-sign", -y, y).exp()
        - fault!("exit-energy-factor", 2.0, 1.0) * xi / mass
            * (static_at_start * expm1_over(-y) + stage.stiffness * xi * second_exponential_integral(y))
}

/// The margin `min W / V0²` over the stage ends ahead and the exit; `None` without an exit or an impact speed.
///
/// - perforated: from the velocities at `events` (stage ends) and at the exit;
/// - stopped at `end` in stage `stage`: W = 0 there, carried on to the exit.
pub fn exit_margin(problem: &Problem, outcome: Outcome, stage: usize, end: State, events: &[Event]) -> Option<f64> {
    if !problem.has_exit() || problem.impact_speed <= 0.0 {
        return None;
    }
    let scale = problem.impact_speed;
    let relative = |w: f64| w / scale / scale;
    if outcome == Outcome::Perforated {
        let mut least = end.velocity / scale;
        for event in events {
            if matches!(event.kind, EventKind::StageEnd(_) | EventKind::CraterEnd) {
                least = least.min(event.state.velocity / scale);
            }
        }
        return Some(fault!("exit-margin-speed", least * least, least));
    }
    Some(relative(energy_beyond_stop(problem, stage, end.depth)))
}

/// Least W [m²/s²] over the stage ends ahead and the exit, carried on from rest at `depth` in stage `stage`.
pub fn energy_beyond_stop<S: Scalar>(problem: &Problem<S>, stage: usize, depth: f64) -> f64 {
    let mut w = 0.0;
    let mut from = depth;
    let mut least = f64::INFINITY;
    for index in stage..problem.stages.len() {
        let law = &problem.stages[index].values();
        let mass = problem.mass.value();
        let to = problem.limit_of(index).value().max(from);
        w = if law.viscosity > 0.0 {
            w - 2.0 * law.static_work(from, to) / mass
        } else {
            carry(law, mass, w, from, to)
        };
        least = least.min(w);
        from = to;
        if law.end >= problem.exit_depth.value() {
            break;
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use smallvec::smallvec;

    use super::*;
    use crate::physics::Target;

    #[test]
    fn a_stop_is_carried_on_by_the_static_work_through_viscous_stages_and_by_the_drag_through_others() {
        // At rest 0.5 m deep in a first stage to 1 m, then to the exit at 3 m; M = 2 kg, p = 5 N, s = 4 N/m, q = 3 kg/m.
        let law = Stage { static_force: 5.0, stiffness: 4.0, viscosity: 0.0, drag: 3.0, end: f64::INFINITY };
        let beyond = |viscosity: [f64; 2]| {
            let [first, second] = viscosity.map(|viscosity| Stage { viscosity, ..law });
            let problem = Problem {
                mass: 2.0,
                impact_speed: 1.0,
                exit_depth: 3.0,
                stages: smallvec![Stage { end: 1.0, ..first }, second],
                crater: None,
                target: Target::Stages,
            };
            energy_beyond_stop(&problem, 0, 0.5)
        };
        // Work of p + s x: 4 J from 0.5 m to 1 m, 26 J from there to 3 m.
        let viscous = beyond([7.0, 7.0]);
        assert_relative_eq!(viscous, -2.0 * (4.0 + 26.0) / 2.0, max_relative = 1e-15);
        // W' = -(5 + 4 x) - 3 W has W = (4 - 15)/9 - 4 x/3 + A e^(-3 x).
        let after = |start: f64, w: f64, end: f64| {
            let particular = |x: f64| -11.0 / 9.0 - 4.0 * x / 3.0;
            particular(end) + (w - particular(start)) * (-3.0 * (end - start)).exp()
        };
        let dry = after(0.5, 0.0, 3.0);
        assert_relative_eq!(beyond([0.0, 0.0]), dry, max_relative = 1e-14);
        assert_relative_eq!(beyond([7.0, 0.0]), after(1.0, -4.0, 3.0), max_relative = 1e-14);
        assert_relative_eq!(beyond([0.0, 7.0]), after(0.5, 0.0, 1.0) - 26.0, max_relative = 1e-14);
    }
}
