//! Are steps too long? A flight that fails is asked anew in parts, each from the exact state at the end of the one before.
//!
//! What is wrong with the force or with a threshold stays: the errors of the parts add up to that of the whole. An error of the
//! steps falls as the parts get shorter, since each of them starts with a short step.

use super::super::causes::{Cause, Certainty};
use super::super::questions::{Content, Question};
use super::super::{Asked, Asking, Diagnosis};
use super::ends;
use crate::exchange::peers::PeerRequest;
use crate::exchange::peers::wire::errors;
use crate::integrators::{Detail, Integrator, Taylor};
use crate::physics::{Problem, Stage};
use crate::studies::verdict::Verdict;

/// Flights that are asked in parts, and that must show it.
const FLIGHTS: usize = 4;
const SHOWN: usize = 3;
/// Numbers of parts.
const PARTS: [usize; 3] = [1, 8, 64];
/// Part of the error of the whole that the parts may have left, in that order.
const LEFT: [f64; 3] = [1.0, 0.25, 0.01];
/// Causes beside which this one says more.
const OPEN: [&str; 2] = ["unknown", "tolerance-missed"];

/// Whether failing flights through one stage are right in parts.
pub(super) fn measured(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
    if found.causes.first().is_some_and(|cause| !OPEN.contains(&cause.id.as_str())) {
        return None;
    }
    let failing = found.questions.iter().filter(|row| row.verdict == Verdict::Failed && row.answered.is_some());
    let of_one_stage = |question: &&Question| {
        question.exact.stage == 0
            && question.problem.impact_speed > 0.0
            && ![Content::Grazing, Content::Drive].iter().any(|content| question.contains.contains(content))
    };
    let flights: Vec<(&Asked, &Question)> = failing
        .filter_map(|row| Some((row, all.iter().find(|question| question.id == row.id).filter(of_one_stage)?)))
        .collect();
    let (mut shown, mut asked) = (0, 0);
    let mut worst = [0.0_f64; PARTS.len()];
    for (row, question) in flights.iter().step_by((flights.len() / FLIGHTS).max(1)).take(FLIGHTS) {
        let errors = PARTS.map(|parts| in_parts(asking, &question.problem, row.rtol?, parts));
        asked += 1;
        let [Some(whole), ..] = errors else { continue };
        let falls = errors.iter().zip(LEFT).all(|(error, left)| error.is_some_and(|error| error <= left * whole));
        if falls {
            shown += 1;
            worst = std::array::from_fn(|index| worst[index].max(errors[index].unwrap_or(0.0)));
        }
    }
    let [whole, few, many] = worst.map(|error| format!("{error:.0e}"));
    let statement = format!(
        "flights that fail are right in parts: errors of {whole} as a whole, {few} in {} and {many} in {} parts. The force is right, and \
         steps are too long: the estimate of their error is wrong, or a coefficient of the scheme",
        PARTS[1], PARTS[2]
    );
    (shown >= SHOWN.min(flights.len()).max(2))
        .then(|| Cause::plain("steps-too-long", statement, Certainty::Likely, shown, asked))
}

/// The sum of the errors of so many parts of the flight through the first stage of `problem`, over its end; one for a part that ends
/// otherwise, `None` where one has no answer.
fn in_parts(asking: &mut Asking<'_>, problem: &Problem, rtol: f64, parts: usize) -> Option<f64> {
    let law = Stage { end: f64::INFINITY, ..problem.stages[0] };
    let whole = Problem::of_stages(problem.mass, problem.impact_speed, [law]).with_exit(problem.exit_depth);
    let solver = Taylor::default();
    let end = solver.solve(&whole, Detail::End).ok()?.end;
    let mut sums = [0.0; 3];
    let (mut from, mut speed) = (0.0, problem.impact_speed);
    for index in 1..=parts {
        let is_rest = index == parts && end.velocity <= 0.0;
        let to = if index == parts { end.depth } else { end.depth * index as f64 / parts as f64 };
        let stage = Stage { static_force: law.static_force + law.stiffness * from, ..law };
        let endless = Problem::of_stages(problem.mass, speed, [stage]);
        let part = if is_rest { endless } else { endless.with_exit(to - from) };
        let exact = solver.solve(&part, Detail::End).ok()?.end;
        let Some([found, exact]) = ends(asking, &part, &PeerRequest::from_problem(&part, rtol)) else {
            if asking.is_gone {
                return None;
            }
            sums[1] += 1.0;
            (from, speed) = (to, exact.velocity);
            continue;
        };
        let [depth, time, velocity] = errors(found, exact, speed);
        sums[0] += depth.abs() * exact.depth / end.depth;
        sums[1] += time.abs() * exact.time / end.time;
        sums[2] += velocity.abs() * speed / problem.impact_speed;
        (from, speed) = (to, exact.velocity);
    }
    // An answer that is off by more than all of it is as wrong as one that ends otherwise.
    sums.into_iter().reduce(f64::max).map(|most| most.min(1.0))
}
