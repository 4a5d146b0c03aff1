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
use super::multistep::{BASHFORTH, Steps, changed_number};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage, State};

/// Sizes `r h` of the steps, the second half the first.
const SIZES: [f64; 2] = [0.1, 0.05];
/// Steps that are looked at, and the first that a start does not reach.
const STEPS: usize = 10;
const STARTED: usize = 4;
/// Parts of a step by which two exits lie behind its end: both must give one state there. Else they are tried nearer to it, by these
/// factors: where the steps themselves are inconsistent, so is what is interpolated between them.
pub(super) const BEHIND: [f64; 2] = [0.1, 0.15];
pub(super) const NEARER: [f64; 2] = [1.0, 0.1];
const NEARER_OF_INCONSISTENT: [f64; 2] = [1.0, 0.001];
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
/// By how much `x + V` may differ from V0 where the force is right.
const ON_PATH: f64 = 1e-3;
/// Slopes from which a step is made at most.
const KEPT_MAX: usize = 4;
/// By how much the power of an error may differ from an integer.
const NEAR: f64 = 0.2;

/// Powers of the size of a step, and sizes (powers of ten) that show where its iteration ends: under `V' = -r V` the term of this power
/// is there in steps of every size, or in the longer ones alone.
const TERMS: [(i32, [i32; 2]); 2] = [(2, [-5, -1]), (3, [-4, -1])];
/// Part of a term by which it may differ where steps are right, and must where they are not.
const RIGHT: f64 = 0.2;
const WRONG: f64 = 0.5;
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

/// The first `count` steps of size `size`.
fn steps(asking: &mut Asking<'_>, (size, count): (f64, usize), may_differ: f64, nearer: [f64; 2]) -> Option<Steps> {
    // M = 1 kg, r = 1 kg/s, V0 = 1 m/s: the time is r t/M, and the depth 1 - V.
    let problem = Problem::of_stages(1.0, 1.0, [Stage { viscosity: 1.0, ..Stage::free() }]);
    let mut off_path = 0.0_f64;
    let mut velocity_behind = |steps: usize, part: f64| {
        let time = (steps as f64 + part) * size;
        let found = state_at(asking, &problem, [size, time, -(-time).exp_m1()])?;
        off_path = off_path.max((found.depth + found.velocity - 1.0).abs());
        Some(found.velocity * (part * size).exp())
    };
    // An interpolant of a step that is wrong is so less near its start.
    let velocities = nearer.into_iter().find_map(|nearer| {
        let mut velocity = |steps: usize| {
            let [one, other] = BEHIND.map(|part| velocity_behind(steps, nearer * part));
            let (one, other) = (one?, other?);
            ((one - other).abs() <= may_differ * size * size).then_some(one)
        };
        let behind = (1..=count).map(&mut velocity).collect::<Option<Vec<_>>>()?;
        Some(std::iter::once(1.0).chain(behind).collect())
    })?;
    Some(Steps { size, velocities, off_path })
}

/// The weights of the last slopes, the newest first, if so few of them give all later steps.
fn weights(Steps { size, velocities, .. }: &Steps) -> Option<Vec<f64>> {
    let later = STARTED..velocities.len() - 1;
    (1..=KEPT_MAX).find_map(|kept| {
        let slopes = DMatrix::from_fn(later.len(), kept, |row, slope| -size * velocities[STARTED + row - slope]);
        let changes = DVector::from_fn(later.len(), |row, _| velocities[STARTED + row + 1] - velocities[STARTED + row]);
        let found = slopes.clone().svd(true, true).solve(&changes, f64::EPSILON).ok()?;
        let left = (slopes * &found - changes).amax();
        (left <= ONE_FACTOR * size).then(|| found.iter().copied().collect())
    })
}

/// Slopes of earlier steps with other weights than those of Adams and Bashforth's scheme of the order `claimed`, as a sentence.
fn other_weights(claimed: f64, [coarse, fine]: &[Steps; 2]) -> Option<String> {
    let right = BASHFORTH.get((claimed.round() as usize).checked_sub(1)?)?;
    let (found, fine) = (weights(coarse)?, weights(fine)?);
    let is_same =
        |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= ONE_WEIGHT);
    let falls_short = (0..claimed.round() as i32).any(|power| {
        let moment: f64 = fine.iter().enumerate().map(|(back, weight)| weight * (-(back as f64)).powi(power)).sum();
        (moment - 1.0 / f64::from(power + 1)).abs() > 2.0 * KEPT_MAX as f64 * ONE_WEIGHT
    });
    let list = |of: &[f64]| of.iter().map(|weight| format!("{weight:.4}")).collect::<Vec<_>>().join(", ");
    (is_same(&found, &fine) && found.len() > 1 && !is_same(&fine, right) && falls_short).then(|| {
        format!(
            "the last slopes have the weights {}, the newest first, where Adams and Bashforth's scheme of order {} has {}",
            list(&fine),
            claimed.round(),
            list(right)
        )
    })
}

/// The steps of both sizes, where later ones multiply V by another number than the first.
pub(super) fn unlike_the_first(asking: &mut Asking<'_>, nearer: [f64; 2]) -> Option<[Steps; 2]> {
    let coarse = steps(asking, (SIZES[0], STEPS), ONE_STATE, nearer)?;
    let is_as_later = (coarse.factor(0) - coarse.factor(STEPS - 1)).abs() <= ONE_FACTOR;
    if is_as_later {
        return None;
    }
    Some([coarse, steps(asking, (SIZES[1], STEPS), ONE_STATE, nearer)?])
}

fn of_weights(statement: String) -> Cause {
    let asked = SIZES.len() * STEPS;
    Cause::plain("scheme-coefficient", statement, Certainty::Certain, asked, asked)
}

/// One number of a known scheme that is another, which no force explains: whatever the weights, `x + V M/r` stays.
pub(super) fn changed(asking: &mut Asking<'_>) -> Option<Cause> {
    let both = unlike_the_first(asking, NEARER_OF_INCONSISTENT)?;
    let is_of_weights = both.iter().all(|steps| steps.off_path <= ON_PATH);
    if is_of_weights { changed_number(&both, STARTED).map(of_weights) } else { None }
}

/// The order of a step, by its errors at both sizes.
fn order_of(both: &[Steps; 2], step: usize) -> Option<f64> {
    let [one, other] = both.each_ref().map(|of| of.factor(step) * of.size.exp() - 1.0);
    let power = (one / other).abs().log2();
    ((power - power.round()).abs() <= NEAR).then(|| power.round() - 1.0)
}

/// What steps show of a scheme that should have the order `claimed`.
pub(super) fn measured(both: &[Steps; 2], claimed: f64) -> Option<Cause> {
    let order = |step| order_of(both, step);
    if let Some(statement) = other_weights(claimed, both).or_else(|| changed_number(both, STARTED)) {
        return Some(of_weights(statement));
    }
    let asked = SIZES.len() * STEPS;
    let (first, later) = (order(0)?, order(STEPS - 1)?);
    let started = (0..STEPS).take_while(|step| order(*step) == Some(first)).count();
    // A start of one order less does no harm, since few steps have it; one of none is a kick.
    if first >= 1.0 && first + 2.0 <= later.min(claimed) && started < STEPS {
        let statement = format!(
            "the first {started} steps of a flight have order {first}, and later ones {later}: a scheme of several steps is started by one \
             of too low an order"
        );
        return Some(Cause::plain("start-low-order", statement, Certainty::Certain, asked, asked));
    }
    None
}

/// The lower order of the later steps, and their first wrong term.
pub(super) fn later(both: &[Steps; 2], claimed: f64) -> Option<Cause> {
    let later = order_of(both, STEPS - 1).filter(|order| (1.0..claimed).contains(order))?;
    let power = later as i32 + 1;
    let [coarse, fine] = both.each_ref().map(|of| (of.factor(STEPS - 1) - (-of.size).exp()) / (-of.size).powi(power));
    let right = (1..=power).fold(1.0, |product, k| product / f64::from(k));
    // Of smaller steps, less what the error has in the next power.
    let found = right + 2.0 * fine - coarse;
    let statement = format!(
        "later steps under V' = z V/h give V the term {found:.3} z^{power}, where order {power} has {right:.3} z^{power}: a weight of the \
         scheme is wrong"
    );
    let asked = SIZES.len() * STEPS;
    let cause = Cause::plain("scheme-coefficient", statement, Certainty::Likely, asked, asked);
    Some(Cause { factor: Some(found / right), ..cause })
}

/// By what part of it one step's term of this `power` is off.
fn term_off(asking: &mut Asking<'_>, power: i32, size: f64) -> Option<f64> {
    let found = steps(asking, (size, 1), ONE_STATE_OF_ITERATION, NEARER)?.factor(0);
    let (mut term, mut before) = (1.0, 0.0);
    for k in 1..=power {
        before += term;
        term *= -size / f64::from(k);
    }
    Some(((found - before) / term - 1.0).abs())
}

/// Whether steps that change V little have another order than those that change it more: an iteration within them ends too early.
pub(super) fn iteration(asking: &mut Asking<'_>, claimed: f64) -> Option<Cause> {
    for (power, [least, greatest]) in TERMS.into_iter().filter(|(power, _)| f64::from(*power) <= claimed) {
        let sizes: Vec<f64> = (least..=greatest).map(|power| 10f64.powi(power)).collect();
        let off: Vec<f64> = sizes.iter().map(|size| term_off(asking, power, *size)).collect::<Option<_>>()?;
        if off.iter().all(|off| *off <= RIGHT) {
            continue;
        }
        let wrong = off.iter().take_while(|off| **off >= WRONG).count();
        if wrong < 2 || wrong == off.len() || off[wrong..].iter().any(|off| *off > RIGHT) {
            return None;
        }
        let (mut low, mut high) = (sizes[wrong - 1], sizes[wrong]);
        for _ in 0..HALVINGS {
            let middle = (low * high).sqrt();
            if term_off(asking, power, middle)? >= WRONG { low = middle } else { high = middle }
        }
        let statement = format!(
            "a step that changes V by a part of {low:.1e} or less has order {}, and one that changes it by more has a higher order: an \
             iteration within the step ends once it changes little",
            power - 1
        );
        let asked = off.len() + HALVINGS;
        return Some(Cause::plain("iteration-loose", statement, Certainty::Certain, asked, asked));
    }
    None
}
