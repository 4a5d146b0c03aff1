//! Are steps too long? A flight that fails is asked anew in parts, each from the exact state at the end of the one before.
//!
//! What is wrong with the force or with a threshold stays: the errors of the parts add up to that of the whole. An error of the
//! steps falls as the parts get shorter, since each of them starts with a short step: as a power of their length. Where it stays
//! and then vanishes at once, each of the shortest parts is a single step, and what is wrong begins with the second.

use super::super::causes::{Cause, Certainty};
use super::super::questions::{Content, Question};
use super::super::simulation::{Rules, simulate};
use super::super::{ALLOWED, Asked, Asking, Diagnosis, TOLERANCES};
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
/// Part of the error of the whole that so many parts may leave.
const LEFT_OF_FEW: f64 = 0.25;
const LEFT: f64 = 0.01;
/// Part of the error of few parts that many may leave, where few are no better than the whole.
const LEFT_OF_MANY: f64 = 1e-3;
/// What twice as many leave at least of an error that is a power of their length, of any order up to 26.
const POWER: f64 = 1e-8;
/// Part of the error by which answers at two tolerances may differ that are one.
const UNMOVED: f64 = 0.01;
/// Error of a flight that is lost.
const EXPLODED: f64 = 0.9;
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
    let (mut falling, mut vanishing, mut unmoved, mut asked) = (0, 0, 0, 0);
    let mut worst = [0.0_f64; PARTS.len()];
    for (row, question) in flights.iter().step_by((flights.len() / FLIGHTS).max(1)).take(FLIGHTS) {
        let mut error = |parts| in_parts(asking, &question.problem, row.rtol?, parts);
        let [Some(whole), Some(few), Some(many)] = PARTS.map(&mut error) else { continue };
        // Where the outcome alone is wrong there is nothing to fall.
        let is_wrong = whole > ALLOWED * row.rtol?;
        asked += usize::from(is_wrong);
        if !is_wrong || many > LEFT * whole {
            continue;
        }
        let steep = if many <= POWER * few { Some(PARTS[1]) } else { (few <= POWER * whole).then_some(PARTS[0]) };
        let doubled: Vec<f64> =
            steep.into_iter().flat_map(|parts| [1, 2, 4, 8].map(|by| by * parts)).map_while(error).collect();
        // A step so long that it explodes leaves nothing right.
        vanishing += usize::from(doubled.windows(2).any(|pair| pair[0] < EXPLODED && pair[1] <= POWER * pair[0]));
        // Few parts may be as wrong as the whole, by chance.
        if few <= LEFT_OF_FEW * whole || many <= LEFT_OF_MANY * few {
            falling += 1;
            unmoved += usize::from(is_unmoved(asking, &question.problem));
        }
        worst = std::array::from_fn(|index| worst[index].max([whole, few, many][index]));
    }
    let [whole, few, many] = worst.map(|error| format!("{error:.0e}"));
    let right = format!(
        "flights that fail are right in parts: errors of {whole} as a whole, {few} in {} and {many} in {} parts.",
        PARTS[1], PARTS[2]
    );
    let needed = SHOWN.min(flights.len()).max(2);
    if vanishing >= needed {
        let statement = format!(
            "{right} Twice as many parts leave nothing of the error where each becomes a single step: what is wrong begins with the \
             second step of a stage, which finds something that the first one left"
        );
        return Some(Cause::plain("step-kept", statement, Certainty::Likely, vanishing, asked));
    }
    let (what, why) = if unmoved == falling {
        (", and the same at every tolerance", "that is ignored, or the estimate of their error is wrong")
    } else {
        ("", "the estimate of their error is wrong, or a coefficient of the scheme")
    };
    let statement = format!("{right} The force is right, and steps are too long{what}: {why}");
    (falling >= needed).then(|| Cause::plain("steps-too-long", statement, Certainty::Likely, falling, asked))
}

/// Whether the flight through `problem` ends alike at the loosest and the tightest tolerance, and wrongly.
fn is_unmoved(asking: &mut Asking<'_>, problem: &Problem) -> bool {
    let [loosest, .., tightest] = TOLERANCES;
    let [loose, tight] =
        [loosest, tightest].map(|rtol| ends(asking, problem, &PeerRequest::from_problem(problem, rtol)));
    let (Some([loose, _]), Some([tight, exact])) = (loose, tight) else { return false };
    let off = |a, b| errors(a, b, problem.impact_speed).map(f64::abs).into_iter().fold(0.0, f64::max);
    off(loose, tight) <= UNMOVED * off(tight, exact)
}

/// The sum of the errors of so many parts, of one length in time, of the flight through the first stage of `problem`, over its
/// end; one for a part that ends otherwise, `None` where one has no answer.
fn in_parts(asking: &mut Asking<'_>, problem: &Problem, rtol: f64, parts: usize) -> Option<f64> {
    let law = Stage { end: f64::INFINITY, ..problem.stages[0] };
    let whole = Problem::of_stages(problem.mass, problem.impact_speed, [law]).with_exit(problem.exit_depth);
    let solver = Taylor::default();
    let end = solver.solve(&whole, Detail::End).ok()?.end;
    let mut sums = [0.0; 3];
    let (mut from, mut speed) = (0.0, problem.impact_speed);
    for index in 1..=parts {
        let stage = Stage { static_force: law.static_force + law.stiffness * from, ..law };
        let endless = Problem::of_stages(problem.mass, speed, [stage]);
        let (part, to) = if index < parts {
            let rules = Rules { end_time: end.time / parts as f64, ..Rules::default() };
            let way = simulate(&endless, rules)?.end.depth;
            (endless.with_exit(way), from + way)
        } else if end.velocity > 0.0 {
            (endless.with_exit(end.depth - from), end.depth)
        } else {
            (endless, end.depth)
        };
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
