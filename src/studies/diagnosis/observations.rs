//! What do the answers show by themselves, without any hypothesis? Looked at where none explains them.

use super::causes::{Cause, Certainty};
use super::questions::Content;
use super::{Answered, QUANTITIES, end_of};
use crate::exchange::peers::PeerAnswer;
use crate::exchange::peers::wire::errors;
use crate::physics::{Outcome, State};

/// Part of the failing answers that must show something, and of the passing ones that may.
const MOST: f64 = 0.9;
const FEW: f64 = 0.1;
/// Relative difference of two numbers that are printed as one.
const SAME: f64 = 1e-12;
/// V over V0 with which nothing is at rest.
const MOVING: f64 = 1e-2;

/// An answer, and whether it fails.
type Judged<'a> = (&'a Answered<'a>, bool);

/// What most failing and few passing answers show.
pub(super) fn shown(judged: &[Judged<'_>]) -> Option<Cause> {
    let failed = judged.iter().filter(|(_, fails)| *fails).count();
    let parts = |is: &dyn Fn(&Answered<'_>) -> bool| {
        let of = |fails: bool| {
            let all = || judged.iter().filter(|(_, is_failing)| *is_failing == fails);
            all().filter(|(answered, _)| is(answered)).count() as f64 / all().count().max(1) as f64
        };
        (of(true), of(false))
    };
    let is_shown = |is: &dyn Fn(&Answered<'_>) -> bool| {
        let (failing, passing) = parts(is);
        failing >= MOST && passing <= FEW
    };
    let plain = |id: &str, statement: String| Some(Cause::plain(id, statement, Certainty::Likely, failed, failed));
    // A stop that still moves, whatever its list says.
    if is_shown(&|answered| last(answered).is_some_and(|answer| is_moving(answered, answer))) {
        return plain("flight-cut-short", "the flight is said to stop, with V > 0 and no exit reached".to_owned());
    }
    if is_shown(&|answered| last(answered).and_then(other_than_event).is_some())
        && let Some((which, event, end)) =
            judged.iter().find(|(_, fails)| *fails).and_then(|(answered, _)| other_than_event(last(answered)?))
    {
        let quantity = QUANTITIES[which];
        return plain(
            "report-differs",
            format!(
                "the last event listed is not the end reported: a {quantity} of {event} in the list, {end} beside it"
            ),
        );
    }
    let is_weak = |answered: &Answered<'_>| answered.question.contains.contains(&Content::WeakTerm);
    if is_shown(&|answered| is_one_error(answered) && is_weak(answered)) {
        let statement = "answers fail where a term is next to nothing beside another, and are the same at every tolerance: \
                         it is dropped, or digits cancel in a formula";
        return plain("digits-lost", statement.to_owned());
    }
    if is_shown(&is_same) {
        let statement = "answers that fail are the same at every tolerance, as with a least step: it is not kept there";
        return plain("tolerance-ignored", statement.to_owned());
    }
    None
}

/// The answer at the tightest tolerance.
fn last<'a>(answered: &'a Answered<'_>) -> Option<&'a PeerAnswer> {
    answered.answers.iter().rev().find_map(|(_, answer)| answer.as_ref().ok())
}

/// The quantity in which the last event differs from the end, with both numbers.
fn other_than_event(answer: &PeerAnswer) -> Option<(usize, f64, f64)> {
    let listed = answer.events.last()?.state;
    let State { depth, time, velocity } = end_of(answer).state;
    let pairs = [(listed.depth, depth), (listed.time, time), (listed.velocity, velocity)];
    let differs = |(a, b): (f64, f64)| (a - b).abs() > SAME * a.abs().max(b.abs());
    (0..3).find(|which| differs(pairs[*which])).map(|which| (which, pairs[which].0, pairs[which].1))
}

fn is_moving(answered: &Answered<'_>, answer: &PeerAnswer) -> bool {
    let problem = &answered.question.problem;
    answer.outcome != Outcome::Perforated
        && answer.velocity_m_s > MOVING * problem.impact_speed
        && answer.depth_m < problem.exit_depth
}

/// Whether the answers at all tolerances are one.
pub(super) fn is_same(answered: &Answered<'_>) -> bool {
    let ends = ends(answered);
    ends.len() > 1 && ends.windows(2).all(|pair| pair[0] == pair[1])
}

/// Whether the answers at all tolerances lie far nearer to each other than to the right one.
pub(super) fn is_one_error(answered: &Answered<'_>) -> bool {
    let (question, ends) = (answered.question, ends(answered));
    let (Some(loosest), Some(tightest)) = (ends.first(), ends.last()) else { return false };
    let over = |a: State, b: State| question.over_condition(errors(a, b, question.problem.impact_speed));
    ends.len() > 1 && over(*loosest, *tightest) < FEW * over(*tightest, question.exact.end)
}

fn ends(answered: &Answered<'_>) -> Vec<State> {
    answered.answers.iter().filter_map(|(_, answer)| Some(end_of(answer.as_ref().ok()?).state)).collect()
}
