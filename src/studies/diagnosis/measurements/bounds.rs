//! Is there a step that is never undercut, or a tolerance, or a tolerance that has a unit? One flight in shorter and shorter times, at
//! tighter and tighter tolerances, and with other units of length and speed: the relative error of a solver whose tolerance is relative
//! stays, and that of one with an absolute tolerance of its own falls as the numbers grow.

use super::super::causes::{Cause, Certainty};
use super::super::{ALLOWED, Asking, Diagnosis, TOLERANCES};
use super::{ends, off};
use crate::exchange::peers::PeerRequest;
use crate::exchange::peers::wire::errors;
use crate::physics::{Problem, Stage, State};

/// Durations (powers of ten, s) of one flight, and its lengths (m): of one duration the length tells a step from a tolerance that is
/// absolute.
const DURATIONS: [i32; 2] = [-7, 1];
const LENGTHS: [f64; 2] = [0.01, 1.0];
/// Durations in a row that must show it.
const SHOWN: usize = 2;

/// Tolerances (powers of ten) from the loosest to the tightest.
const POWERS: [i32; 2] = [-13, -2];
/// Tolerances that must give one answer.
const ALIKE: usize = 3;
/// Their error over the tightest of them from which it is none of a solver that has done its best.
const FAR: f64 = 100.0;

/// Exits beside that of the flight, the distance between two (m), and the part of an error by which it differs there at most: round-off is
/// another at each.
const BESIDE: usize = 6;
const BETWEEN: f64 = 1e-4;
const SMOOTH: f64 = 0.1;

/// Factors of length and speed, powers of two.
const SIZES: [f64; 4] = [1.0 / 1024.0, 1.0 / 32.0, 1.0, 32.0];
/// By how much the error falls at least from one size to the next, and from the first to the last.
const FALLS: f64 = 3.0;
const FALLS_IN_ALL: f64 = 1e3;
/// Part by which a fall of the error with the size differs from the ratio of sizes.
const SAME_FALL: f64 = 0.05;

/// A flight of a length in a time, nearly, with two terms.
fn flight(length: f64, duration: f64) -> Problem {
    let speed = length / duration;
    let stage = Stage::tunnel(0.2 * speed * speed / length, 0.3 / length);
    Problem::of_stages(1.0, speed, [stage]).with_exit(0.8 * length)
}

/// What a flight shows of its steps.
#[derive(Clone, Copy, PartialEq)]
enum Steps {
    /// They follow the tolerance.
    Free,
    /// They are the same at two tolerances, and too long.
    Bound,
    /// It ends otherwise, or not at all.
    Lost,
    /// Nothing of these.
    Other,
}

/// Difference of two answers over their error, below which they are one: tolerances that are scaled differ in their last digits.
const SAME: f64 = 1e-3;

/// Whether flights below some duration are the same at every tolerance, and wrong.
pub(super) fn least_step(asking: &mut Asking<'_>) -> Option<Cause> {
    let mut of = |length: f64, duration: f64| -> Steps {
        let problem = flight(length, duration);
        let mut at = |rtol| ends(asking, &problem, &PeerRequest::from_problem(&problem, rtol));
        let [Some([looser, _]), Some([found, exact])] = [at(TOLERANCES[1]), at(TOLERANCES[2])] else {
            return Steps::Lost;
        };
        let error = off(found, exact, problem.impact_speed);
        match () {
            () if error <= ALLOWED * TOLERANCES[2] => Steps::Free,
            () if off(looser, found, problem.impact_speed) <= SAME * error => Steps::Bound,
            () => Steps::Other,
        }
    };
    // From the longest on.
    let durations: Vec<f64> = (DURATIONS[0]..=DURATIONS[1]).rev().map(|power| 10f64.powi(power)).collect();
    let mut found = Vec::with_capacity(durations.len());
    for duration in &durations {
        let [one, other] = LENGTHS.map(|length| of(length, *duration));
        found.push(if one == other { one } else { Steps::Other });
    }
    let free = found.iter().take_while(|steps| **steps == Steps::Free).count();
    // A step far longer than the flight may end it anywhere.
    let bound = found.iter().rev().take_while(|steps| matches!(**steps, Steps::Bound | Steps::Lost)).count();
    // One or two durations in between may lie on either side.
    let is_shown = free >= SHOWN && bound >= SHOWN && found.contains(&Steps::Bound) && free + bound + 2 >= found.len();
    let longest = durations[durations.len() - bound.max(1)];
    let statement = format!(
        "flights of {longest:.0e} s and less have one answer at every tolerance, and longer ones are right: there is a least step, \
         which the tolerance does not undercut"
    );
    let asked = 2 * LENGTHS.len() * durations.len();
    is_shown.then(|| Cause::plain("least-step", statement, Certainty::Likely, asked, asked))
}

/// Whether answers follow the tolerance down to one below which they are the same, and wrong.
pub(super) fn least_tolerance(asking: &mut Asking<'_>) -> Option<Cause> {
    let problem = flight(1.0, 0.01);
    let tolerances: Vec<f64> = (POWERS[0]..=POWERS[1]).map(|power| 10f64.powi(power)).collect();
    let mut exact = State { time: 0.0, depth: 0.0, velocity: 0.0 };
    let mut found = Vec::with_capacity(tolerances.len());
    for rtol in &tolerances {
        let [state, right] = ends(asking, &problem, &PeerRequest::from_problem(&problem, *rtol))?;
        exact = right;
        found.push(state);
    }
    let error = off(found[0], exact, problem.impact_speed);
    let alike = found.iter().take_while(|state| off(**state, found[0], problem.impact_speed) <= SAME * error).count();
    let is_shown = alike >= ALIKE && alike < found.len() && error > FAR * tolerances[0];
    let least = tolerances[alike - 1];
    let statement = format!(
        "answers at tolerances of {least:.0e} and less are one, with an error of {error:.0e}, and looser ones differ: no tolerance \
         below about {least:.0e} is taken"
    );
    is_shown.then(|| Cause::plain("tolerance-ignored", statement, Certainty::Likely, alike, found.len()))
}

/// Whether errors that stop falling with the tolerance, as in single precision, are nearly the same at exits close to each other.
pub(super) fn smooth_floor(asking: &mut Asking<'_>, found: &Diagnosis) -> Option<Cause> {
    let floor = found.causes.first().filter(|cause| cause.id == "single-precision")?;
    let problem = flight(1.0, 0.01);
    let mut errors_at = |index: usize| {
        let beside = problem.clone().with_exit(problem.exit_depth + BETWEEN * index as f64);
        let [found, exact] = ends(asking, &beside, &PeerRequest::from_problem(&beside, TOLERANCES[2]))?;
        Some(errors(found, exact, problem.impact_speed))
    };
    let all: Vec<[f64; 3]> = (0..=BESIDE).map(&mut errors_at).collect::<Option<_>>()?;
    let worst = all[0].iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
    let differs = |beside: &[f64; 3]| (0..3).any(|which| (beside[which] - all[0][which]).abs() > SMOOTH * worst);
    if worst <= FAR * TOLERANCES[2] || all.iter().any(differs) {
        return None;
    }
    let statement = format!(
        "{}, and are nearly one at exits close to each other, so that they are those of steps: no tolerance below some bound is taken",
        floor.statement
    );
    Some(Cause::plain("tolerance-ignored", statement, Certainty::Likely, floor.explains, floor.of))
}

/// Whether the error falls as lengths and speeds grow, at one relative tolerance.
pub(super) fn absolute_tolerance(asking: &mut Asking<'_>) -> Option<Cause> {
    let flights = [(500.0, 0.5), (50.0, 2.0), (2000.0, 0.1)];
    let mut error_of = |size: f64| {
        let errors = flights.map(|(static_force, drag)| {
            let stage = Stage::tunnel(static_force * size, drag / size);
            let problem = Problem::of_stages(1.0, 100.0 * size, [stage]).with_exit(size);
            // An exit that is not reached is as wrong as can be.
            let ends = ends(asking, &problem, &PeerRequest::from_problem(&problem, TOLERANCES[1]));
            ends.map_or(1.0, |[found, exact]| off(found, exact, problem.impact_speed))
        });
        errors.into_iter().fold(f64::EPSILON, f64::max)
    };
    let found = SIZES.map(&mut error_of);
    let [smallest, .., largest] = found[..] else { return None };
    // The smallest takes the first step that is tried, whatever the tolerance, and the next may too.
    let falls = found[0] >= found[1] && found[1..].windows(2).all(|pair| pair[0] >= FALLS * pair[1]);
    // What is added to the equation, and has a unit, falls as the size does: that is no tolerance.
    let by_size =
        |(errors, sizes): (&[f64], &[f64])| (errors[0] * sizes[0] / (errors[1] * sizes[1]) - 1.0).abs() < SAME_FALL;
    if found.windows(2).zip(SIZES.windows(2)).skip(1).all(by_size) {
        return None;
    }
    let statement = format!(
        "at one relative tolerance the error falls from {smallest:.0e} to {largest:.0e} as the same flight grows {:.0} times \
         in length and speed: the tolerance, or that of an iteration, is an absolute one, whatever is asked for",
        SIZES[SIZES.len() - 1] / SIZES[0]
    );
    let asked = SIZES.len() * flights.len();
    (falls && smallest >= FALLS_IN_ALL * largest)
        .then(|| Cause::plain("absolute-tolerance", statement, Certainty::Likely, asked, asked))
}
