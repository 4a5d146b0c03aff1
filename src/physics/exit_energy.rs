//! The exit margin: how much energy is left at the exit depth, continued below zero for a stop.
//!
//! With `W = V²` the equation of motion reads `dW/dx = -2 F/M`. For `r = 0` it is linear in W and goes on smoothly
//! through `W < 0`, so `W(exit)` is one affine function of `V0²` for stops and perforations alike; its root is the
//! critical velocity, and its sign decides the outcome (docs/theory.md, section 6). Across a stage with `r > 0`, or with a
//! [`Law`](super::Law) of its own, a stop is continued by minus twice the static work per mass.
//!
//! A target may hold a barrier and drive the projectile beyond it. Then the least W over the path decides. It occurs
//! at a stage end, because inside a stage with `s >= 0` the velocity may have a maximum but no minimum, and a stage with
//! `s < 0` ends where its force would fall through zero (docs/theory.md, section 9). The margin is
//! therefore the least W over the stage ends ahead and the exit; for a target that only resists, that is W(exit).

use super::problem::{Problem, Stage, State};
use super::scalar::{Differentiable, Scalar};

/// `E(z) = expm1(z)/z`, 1 at zero.
#[inline]
pub(crate) fn expm1_over<S: Differentiable>(z: S) -> S {
    let x = z.value();
    let mean = if x == 0.0 { 1.0 } else { x.exp_m1() / x };
    // E'(z) = (e^z - E)/z = e^z G(z), the second form without the cancellation at zero.
    z.apply(mean, || if x.abs() < 0.3 { x.exp() * second_exponential_integral(x) } else { (x.exp() - mean) / x })
}

/// `(1 + z/8)^8`, which is below `e^z` for z > 0, by 6 % at z = 1; a bound in four multiplications.
#[inline(always)]
pub(crate) fn exp_from_below(z: f64) -> f64 {
    let root = 1.0 + 0.125 * z;
    let fourth = (root * root) * (root * root);
    fourth * fourth
}

/// `G(y) = (y + expm1(-y))/y²`, 1/2 at zero.
///
/// Below |y| = 0.3 by its Taylor series, whose first neglected term is under 1e-18; above, the subtraction costs at
/// most four bits.
pub(crate) fn second_exponential_integral<S: Differentiable>(y: S) -> S {
    if y.value().abs() < 0.3 {
        // sum over n >= 0 of (-y)^n/(n + 2)!, nested: 1/2 (1 - y/3 (1 - y/4 (...)))
        (2..16_u32).rev().fold(S::zero(), |sum, n| (S::one() - y * sum) / S::from_f64(f64::from(n)))
    } else {
        (y + (-y).exp_m1()) / (y * y)
    }
}

/// W = V² at depth `to` (m²/s²), from `w` at depth `from`, through one stage without viscosity:
///
/// ```text
/// W(to) = W e^{-y} - (2 xi/M) ((p + s from) E(-y) + s xi (y + expm1(-y))/y²),  y = 2 q xi/M,  xi = to - from
/// ```
///
/// with `E(z) = expm1(z)/z`. Exact for r = 0 and for W of either sign.
pub fn propagate<S: Differentiable>(stage: &Stage<S>, mass: S, w: S, from: S, to: S) -> S {
    let two = S::from_f64(2.0);
    let xi = to - from;
    let y = two * stage.drag * xi / mass;
    let static_at_start = stage.static_force + stage.stiffness * from;
    w * (-y).exp()
        - two * xi / mass * (static_at_start * expm1_over(-y) + stage.stiffness * xi * second_exponential_integral(y))
}

/// Least W (m²/s²) over the stop itself, the stage ends ahead and the exit, continued from rest at `depth` in stage `stage`.
///
/// Ahead of a stop W is negative, save where the force vanishes with the speed and round-off decides that it drives.
pub fn energy_beyond_stop<S: Scalar>(problem: &Problem<S>, stage: usize, depth: f64) -> f64 {
    energy_beyond_stop_of(problem, stage, depth, problem.mass.value())
}

/// As [`energy_beyond_stop`], where `mass` (kg) moves.
#[inline]
pub(crate) fn energy_beyond_stop_of<S: Scalar>(problem: &Problem<S>, stage: usize, depth: f64, mass: f64) -> f64 {
    let least = continued(problem, stage, depth, mass, 0.0, f64::INFINITY);
    // A NaN stays what it is.
    if least > 0.0 { 0.0 } else { least }
}

/// Least W (m²/s²) of a flight that never ends, the counterpart of [`energy_beyond_stop`].
///
/// `at` is any of its states in the stage in which it approaches a depth X for ever.
///
/// - Viscosity and drag alone: V vanishes at `X = x + (M/q) ln(1 + q V/r)`. W at the end of the stage is taken as
///   `-(r (end - X)/M)²`, which has the sign of the missing speed.
/// - A law of its own whose force vanishes with the velocity: `V0² (X - H)/H`.
/// - A spring that balances a drive at `X = -p/s`: minus twice the static work per mass from X to the end.
///
/// `None` without an exit, or in a stage of another kind.
pub fn energy_beyond_approach(problem: &Problem, at: State) -> Option<f64> {
    // The depth does not tell the stage.
    if problem.laws.have_conditions() {
        return None;
    }
    let index = (0..problem.stages.len()).find(|&index| problem.limit_of(index) > at.depth)?;
    if let Some(law) = problem.laws.of(index) {
        let (speed, exit) = (problem.impact_speed, problem.exit_depth);
        let beyond = speed * speed * ((at.depth + law.reach(problem.mass, at)) / exit - 1.0);
        return (problem.has_exit() && beyond < 0.0).then_some(beyond);
    }
    let (law, limit) = (&problem.stages[index], problem.limit_of(index));
    let w = if let Some(missing) = speed_missing(law, problem.mass, at, limit) {
        -missing * missing
    } else if law.static_force < 0.0 && law.stiffness > 0.0 {
        let missing = (limit + law.static_force / law.stiffness).max(0.0);
        -law.stiffness * missing * missing / problem.mass
    } else {
        return None;
    };
    let beyond =
        if law.end < problem.exit_depth { continued(problem, index + 1, limit, problem.mass, w, w) } else { w };
    (problem.has_exit() && beyond.is_finite()).then_some(beyond)
}

/// The speed (m/s) that a projectile at `at` lacks to reach `limit` through a stage of viscosity and drag alone.
///
/// `None` if it gets there, and for a stage of another kind.
pub(crate) fn speed_missing(law: &Stage, mass: f64, at: State, limit: f64) -> Option<f64> {
    let Stage { static_force, stiffness, viscosity, drag, .. } = *law;
    if static_force != 0.0 || stiffness != 0.0 || viscosity <= 0.0 {
        return None;
    }
    let ratio = drag * at.velocity / viscosity;
    let log_over = if ratio == 0.0 { 1.0 } else { ratio.ln_1p() / ratio };
    let missing = viscosity * (limit - at.depth) / mass - at.velocity * log_over;
    (missing >= 0.0).then_some(missing)
}

/// Least of `least` and of W (m²/s²) at the stage ends from stage `stage` on and at the exit, from `w` at `depth` with `mass` (kg).
///
/// An end on a condition is that at rest, and a mass that joins there shares the momentum: `W -> W (m/(m + added))²`.
fn continued<S: Scalar>(problem: &Problem<S>, stage: usize, depth: f64, mass: f64, w: f64, least: f64) -> f64 {
    let (mut w, mut from, mut least, mut mass) = (w, depth, least, mass);
    let mut next = stage;
    for index in stage..problem.stages.len() {
        if index < next {
            continue;
        }
        next = index + 1;
        let law = &problem.stages[index].values();
        let mut to = problem.limit_of(index).value().max(from);
        let mut leaves = law.end >= problem.exit_depth.value();
        w = if let Some(law) = problem.laws.of(index) {
            if index > stage
                && let Some((added, _)) = law.joining(S::from_f64(from))
            {
                let share = mass / (mass + added.value());
                w *= share * share;
                mass += added.value();
            }
            if let Some(end) = law.end()
                && let Some(place) = end.met_at_rest(from, to)
            {
                (to, next, leaves) = (place, end.next(), place >= problem.exit_depth.value());
            }
            let (work, most) = law.static_work(from, to);
            least = least.min(w - 2.0 * most / mass);
            w - 2.0 * work / mass
        } else if law.viscosity > 0.0 {
            w - 2.0 * law.static_work(from, to) / mass
        } else {
            propagate(law, mass, w, from, to)
        };
        least = least.min(w);
        from = to;
        if leaves {
            break;
        }
    }
    least
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// M = 2 kg: at 1 m/s, 0.5 m deep, r = 4 kg/s takes 2 m/s for each metre, so that x = 1 m is approached.
    #[test]
    fn a_flight_that_never_ends_lacks_the_speed_to_its_boundary_and_the_static_work_beyond() {
        let still = Stage::free();
        let at = State { time: 0.0, depth: 0.5, velocity: 1.0 };
        let of = |first: Stage, exit_depth| {
            Problem::of_stages(2.0, 3.0, [first, Stage { static_force: 5.0, ..still }]).with_exit(exit_depth)
        };
        let slowing = Stage { viscosity: 4.0, end: 2.0, ..still };
        // 2 m/s are missing at 2 m; to the exit at 3 m, 2 5 N 1 m/2 kg more.
        assert_relative_eq!(energy_beyond_approach(&of(slowing, 2.0), at).unwrap(), -4.0, max_relative = 1e-15);
        assert_relative_eq!(energy_beyond_approach(&of(slowing, 3.0), at).unwrap(), -9.0, max_relative = 1e-15);
        assert_relative_eq!(energy_beyond_approach(&of(slowing, 1.0), at).unwrap(), 0.0);
        // Within reach it is no approach, nor without an exit.
        assert_eq!(energy_beyond_approach(&of(slowing, 0.9), at), None);
        assert_eq!(energy_beyond_approach(&of(slowing, f64::INFINITY), at), None);
        // Drag shortens the distance to (M/q) ln(1 + q V/r): with q = 4 kg/m to ln(2)/2 m.
        let dragged = Stage { drag: 4.0, ..slowing };
        let missing = 2.0 * (1.5 - 0.5 * std::f64::consts::LN_2);
        assert_relative_eq!(
            energy_beyond_approach(&of(dragged, 2.0), at).unwrap(),
            -missing * missing,
            max_relative = 1e-15
        );
        // A drive spent at 6 N/8 N/m = 0.75 m: 8 (2 - 0.75)²/2 to the end.
        let driven = Stage { static_force: -6.0, stiffness: 8.0, ..slowing };
        assert_relative_eq!(energy_beyond_approach(&of(driven, 2.0), at).unwrap(), -6.25, max_relative = 1e-15);
        // Nothing else is approached: not what a force or a spring stops, nor what a drive pushes through.
        for (static_force, stiffness) in [(1.0, 0.0), (1.0, 2.0), (0.0, 8.0), (-1.0, 0.0)] {
            let other = Stage { static_force, stiffness, ..slowing };
            assert_eq!(energy_beyond_approach(&of(other, 2.0), at), None, "{other:?}");
        }
        // At the end of a stage it is the next that holds the projectile.
        let behind = Problem::of_stages(2.0, 3.0, [still.until(0.5), slowing, still]).with_exit(2.0);
        assert_relative_eq!(energy_beyond_approach(&behind, at).unwrap(), -4.0, max_relative = 1e-15);
    }

    #[test]
    fn a_stop_is_continued_by_the_static_work_through_viscous_stages_and_by_the_drag_through_others() {
        // At rest 0.5 m deep in a first stage to 1 m, then to the exit at 3 m; M = 2 kg, p = 5 N, s = 4 N/m, q = 3 kg/m.
        let law = Stage { static_force: 5.0, stiffness: 4.0, viscosity: 0.0, drag: 3.0, end: f64::INFINITY };
        let beyond = |viscosity: [f64; 2]| {
            let [first, second] = viscosity.map(|viscosity| Stage { viscosity, ..law });
            let problem = Problem::of_stages(2.0, 1.0, [first.until(1.0), second]).with_exit(3.0);
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
