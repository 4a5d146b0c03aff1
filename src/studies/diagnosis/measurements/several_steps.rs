//! What does a scheme of fixed steps make of one step after another? Under `V' = -r V` each multiplies V by a number that nears
//! `exp(-r h)`: those at the start show how a scheme of several steps is started, and from the later ones the weights of its slopes follow.
//!
//! The state at the end of a step is that at an exit a little behind it, taken back by the right flight: whether the last step is
//! shortened, interpolated, or taken by another scheme matters little there.
//!
//! Source: Hairer, Nørsett, Wanner (1993), Solving Ordinary Differential Equations I, section III.1.

use nalgebra::{DMatrix, DVector};

use super::super::causes::{Cause, Certainty};
use super::super::{Asking, TOLERANCES, end_of};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage, State};

/// Sizes `r h` of the steps, the second half the first.
const SIZES: [f64; 2] = [0.1, 0.05];
/// Steps that are looked at, and the first that a start does not reach.
const STEPS: usize = 10;
const STARTED: usize = 4;
/// Parts of a step by which two exits lie behind its end: both must give one state there. Else they are tried this much nearer to it.
pub(super) const BEHIND: [f64; 2] = [0.1, 0.15];
const NEARER: f64 = 0.1;
/// By how much two values of V at the end of a step may differ, over the square of its size. An interpolation by a chord exceeds both;
/// a last step of order 1, which an iteration that ends at once makes of every step, exceeds the first alone.
const ONE_STATE: f64 = 1e-3;
const ONE_STATE_OF_ITERATION: f64 = 0.01;
/// Iterations for the depth of an exit, and the part of a step by which its time may be off.
const ITERATIONS_MAX: usize = 12;
const ON_TIME: f64 = 1e-11;
/// Difference of two factors of V that are the same, and of two weights.
const ONE_FACTOR: f64 = 1e-7;
const ONE_WEIGHT: f64 = 2e-3;
/// Slopes from which a step is made at most, and the highest order of [`adams`].
const KEPT_MAX: usize = 4;
/// By how much the power of an error may differ from an integer.
const NEAR: f64 = 0.2;

/// Sizes of steps (powers of ten) from which an iteration shows where it ends, and the half that `(V1/V0 - 1 + z)/z²` nears.
const POWERS: [i32; 2] = [-5, -1];
const HALF: f64 = 0.5;
/// By how much it may differ where steps are right, and must where they are not.
const RIGHT: f64 = 0.1;
const WRONG: f64 = 0.25;
/// Halvings of a bracket of sizes.
const HALVINGS: usize = 8;

/// The state at the end of the flight through `problem` with an exit, by steps of `step` (s), that takes `time` (s); `guess` is its exit.
pub(super) fn state_at(asking: &mut Asking<'_>, problem: &Problem, [step, time, guess]: [f64; 3]) -> Option<State> {
    let mut exit = guess;
    for _ in 0..ITERATIONS_MAX {
        let problem = problem.clone().with_exit(exit);
        let request = PeerRequest { dt_s: Some(step), ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
        let end = end_of(&asking.ask(&request).ok()?).state;
        if (end.time - time).abs() <= ON_TIME * step {
            return Some(State { depth: exit, ..end });
        }
        exit += (time - end.time) * end.velocity;
        if !(exit > 0.0) {
            return None;
        }
    }
    None
}

/// The factors by which the first `count` steps of size `size` multiply V.
fn factors(asking: &mut Asking<'_>, size: f64, count: usize, may_differ: f64) -> Option<Vec<f64>> {
    // M = 1 kg, r = 1 kg/s, V0 = 1 m/s: the time is r t/M, and the depth 1 - V.
    let problem = Problem::of_stages(1.0, 1.0, [Stage { viscosity: 1.0, ..Stage::free() }]);
    let mut velocity_behind = |steps: usize, part: f64| {
        let time = (steps as f64 + part) * size;
        let found = state_at(asking, &problem, [size, time, -(-time).exp_m1()])?;
        Some(found.velocity * (part * size).exp())
    };
    // An interpolant of a step that is wrong is so less near its start.
    [1.0, NEARER].into_iter().find_map(|nearer| {
        let mut before = 1.0;
        let mut factor = |steps: usize| {
            let [one, other] = BEHIND.map(|part| velocity_behind(steps, nearer * part));
            let (one, other) = (one?, other?);
            ((one - other).abs() <= may_differ * size * size).then(|| one / std::mem::replace(&mut before, one))
        };
        (1..=count).map(&mut factor).collect()
    })
}

/// The weights of the last slopes, the newest first, if so few of them give all later steps.
fn weights(factors: &[f64], size: f64) -> Option<Vec<f64>> {
    let velocities: Vec<f64> = std::iter::once(1.0)
        .chain(factors.iter().scan(1.0, |velocity, factor| {
            *velocity *= factor;
            Some(*velocity)
        }))
        .collect();
    let later = STARTED..factors.len();
    (1..=KEPT_MAX).find_map(|kept| {
        let slopes = DMatrix::from_fn(later.len(), kept, |row, slope| -size * velocities[STARTED + row - slope]);
        let changes = DVector::from_fn(later.len(), |row, _| velocities[STARTED + row + 1] - velocities[STARTED + row]);
        let found = slopes.clone().svd(true, true).solve(&changes, f64::EPSILON).ok()?;
        let left = (slopes * &found - changes).amax();
        (left <= ONE_FACTOR * size).then(|| found.iter().copied().collect())
    })
}

/// The weights of Adams and Bashforth's scheme of this order, up to four.
fn adams(order: usize) -> Option<&'static [f64]> {
    match order {
        1 => Some(&[1.0]),
        2 => Some(&[1.5, -0.5]),
        3 => Some(&[23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0]),
        4 => Some(&[55.0 / 24.0, -59.0 / 24.0, 37.0 / 24.0, -9.0 / 24.0]),
        _ => None,
    }
}

/// What steps show of a scheme that should have the order `claimed`.
pub(super) fn measured(asking: &mut Asking<'_>, claimed: f64) -> Option<Cause> {
    if let Some(cause) = iteration(asking) {
        return Some(cause);
    }
    let [Some(coarse), Some(fine)] = SIZES.map(|size| factors(asking, size, STEPS, ONE_STATE)) else { return None };
    let asked = SIZES.len() * STEPS;
    // The order of a step, by its errors at both sizes.
    let order = |step: usize| {
        let [one, other] = [(&coarse, SIZES[0]), (&fine, SIZES[1])].map(|(of, size)| of[step] * size.exp() - 1.0);
        let power = (one / other).abs().log2();
        ((power - power.round()).abs() <= NEAR).then(|| power.round() - 1.0)
    };
    let is_as_later = |step: usize| (coarse[step] - coarse[STEPS - 1]).abs() <= ONE_FACTOR;
    if is_as_later(0) {
        return None;
    }
    let [coarse_weights, fine_weights] = [weights(&coarse, SIZES[0]), weights(&fine, SIZES[1])];
    if let (Some(found), Some(fine)) = (coarse_weights, fine_weights)
        && let Some(right) = adams(claimed.round() as usize)
        && found.len() == fine.len()
        && found.len() > 1
        && found.iter().zip(&fine).all(|(one, other)| (one - other).abs() <= ONE_WEIGHT)
    {
        let is_right = right.len() == found.len()
            && found.iter().zip(right).all(|(found, right)| (found - right).abs() <= ONE_WEIGHT);
        let falls_short = (0..claimed.round() as i32).any(|power| {
            let moment: f64 = fine.iter().enumerate().map(|(back, weight)| weight * (-(back as f64)).powi(power)).sum();
            (moment - 1.0 / f64::from(power + 1)).abs() > 2.0 * KEPT_MAX as f64 * ONE_WEIGHT
        });
        if !is_right && falls_short {
            let list = |of: &[f64]| of.iter().map(|weight| format!("{weight:.4}")).collect::<Vec<_>>().join(", ");
            let statement = format!(
                "the last slopes have the weights {}, the newest first, where Adams and Bashforth's scheme of order {} has {}",
                list(&fine),
                claimed.round(),
                list(right)
            );
            return Some(Cause::plain("scheme-coefficient", statement, Certainty::Certain, asked, asked));
        }
    }
    let (first, later) = (order(0)?, order(STEPS - 1)?);
    let started = (0..STEPS).take_while(|step| order(*step) == Some(first)).count();
    // A start of one order less does no harm, since few steps have it; one of none is a kick.
    (first >= 1.0 && first + 2.0 <= later.min(claimed) && started < STEPS).then(|| {
        let statement = format!(
            "the first {started} steps of a flight have order {first}, and later ones {later}: a scheme of several steps is started by one \
             of too low an order"
        );
        Cause::plain("start-low-order", statement, Certainty::Certain, asked, asked)
    })
}

/// Whether steps that change V little have another order than those that change it more: an iteration within them ends too early.
fn iteration(asking: &mut Asking<'_>) -> Option<Cause> {
    let mut second = |size: f64| {
        let change = factors(asking, size, 1, ONE_STATE_OF_ITERATION)?[0] - 1.0 + size;
        Some((change / (size * size) - HALF).abs())
    };
    let sizes: Vec<f64> = (POWERS[0]..=POWERS[1]).map(|power| 10f64.powi(power)).collect();
    let off: Vec<f64> = sizes.iter().map(|size| second(*size)).collect::<Option<_>>()?;
    let wrong = off.iter().take_while(|off| **off >= WRONG).count();
    if wrong < 2 || wrong == off.len() || off[wrong..].iter().any(|off| *off > RIGHT) {
        return None;
    }
    let (mut low, mut high) = (sizes[wrong - 1], sizes[wrong]);
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        if second(middle)? >= WRONG { low = middle } else { high = middle }
    }
    let statement = format!(
        "a step that changes V by a part of {low:.1e} or less has order 1, and one that changes it by more has a higher order: an iteration \
         within the step ends once it changes little"
    );
    let asked = off.len() + HALVINGS;
    Some(Cause::plain("iteration-loose", statement, Certainty::Certain, asked, asked))
}
