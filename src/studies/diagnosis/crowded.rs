//! Does a solver of fixed steps that lists events list each end of a stage where several lie in one step?
//!
//! On its ladder every stage takes twenty steps at least (`ladder`), so that two ends never share one. Here they do. Steps that long
//! tell no limit, so that the list alone is judged, and not its numbers.

use super::questions::{Content, Question};
use super::tolerances::wrong_list;
use super::{Asked, Asking, TOLERANCES, end_of, expected, request};
use crate::exchange::peers::PeerRequest;
use crate::integrators::VelocityAt;
use crate::integrators::central_difference::stability_limit;
use crate::physics::{Event, EventKind};
use crate::studies::verdict::Verdict;

/// Questions at most.
const ASKED: usize = 12;
/// Step over the shortest time between two ends: two in three such pairs lie in one step.
const OVER_SHORTEST: f64 = 3.0;
/// The shortest step over the duration of the flight, and the longest: of any flight, and of one that is hardly slowed.
const SHORTEST: f64 = 1.0 / 400.0;
const LONGEST: f64 = 1.0 / 60.0;
const LONGEST_OF_FAST: f64 = 1.0 / 8.0;
/// V over V0 of a flight that is hardly slowed.
const FAST: f64 = 0.5;
/// Part of V0 below which an end may be missed: with steps so long a scheme may rest before it.
const OPEN_SPEED: f64 = 0.2;
/// Longest step over the stability limit of a stage.
const PART_OF_LIMIT: f64 = 0.5;

/// A step (s) in which several ends lie that `question` passes at a fair speed.
fn step(question: &Question) -> Option<f64> {
    let unfit = [Content::Grazing, Content::NoSpeed, Content::ExitAtStageEnd, Content::Stiff];
    if question.contains.iter().any(|content| unfit.contains(content)) {
        return None;
    }
    let (problem, exact) = (&question.problem, &question.exact);
    let is_end = |event: &&Event| {
        let is_of_stage = matches!(event.kind, EventKind::StageEnd(_) | EventKind::CraterEnd);
        is_of_stage && event.state.velocity >= OPEN_SPEED * problem.impact_speed
    };
    let times: Vec<f64> = exact.events.iter().filter(is_end).map(|event| event.state.time).collect();
    let shortest =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|time| *time > 0.0).fold(f64::INFINITY, f64::min);
    let is_fast = exact.end.velocity > FAST * problem.impact_speed;
    let most = exact.end.time * if is_fast { LONGEST_OF_FAST } else { LONGEST };
    let fastest = exact.events.iter().map(|event| event.state.velocity).fold(problem.impact_speed, f64::max);
    let stable = problem
        .stages
        .iter()
        .map(|law| PART_OF_LIMIT * stability_limit(law, problem.mass, fastest, VelocityAt::LaggedHalfStep))
        .fold(most, f64::min);
    Some((OVER_SHORTEST * shortest).max(SHORTEST * exact.end.time)).filter(|step| *step <= stable)
}

/// Rows of questions with such steps, of a solver that lists events; one that ends otherwise at so long a step is not judged.
pub(super) fn crowded(asking: &mut Asking<'_>, all: &[Question]) -> Vec<Asked> {
    let mut rows = Vec::new();
    for (question, step) in all.iter().filter_map(|question| Some((question, step(question)?))).take(ASKED) {
        let asked = PeerRequest { dt_s: Some(step), ..request(question, TOLERANCES[0]) };
        // Nobody promises an answer at such a step.
        let Ok(answer) = asking.ask(&asked) else { continue };
        if answer.events.is_empty() {
            break;
        }
        if !answer.outcome.agrees_with(question.exact.outcome) {
            continue;
        }
        let is_open = |event: &Event| event.state.velocity < OPEN_SPEED * question.problem.impact_speed;
        let wrong = wrong_list(question, &asked, &answer, is_open);
        rows.push(Asked {
            id: format!("{}-in-one-step", question.id),
            contains: question.contains.clone(),
            verdict: if wrong.is_some() { Verdict::Failed } else { Verdict::Passed },
            rtol: None,
            dt_s: Some(step),
            expected: expected(question),
            answered: Some(end_of(&answer)),
            relative_error: None,
            limit: None,
            reason: wrong
                .map_or_else(String::new, |said| format!("{said}, where ends of several stages lie in one step")),
        });
    }
    rows
}
