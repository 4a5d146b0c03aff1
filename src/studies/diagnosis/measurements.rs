//! What does a solver do, as questions made for it measure? Asked where no known fault explains its answers with certainty.
//!
//! - Asked anew: whether a solver that has just started gives other answers.
//! - Of the time: whether it alone is wrong, or all rates have one factor (`clock`).
//! - Of the force: the drag, speed by speed (`drag`), and how each term alone grows with the numbers of a question (`scaling`).
//! - Of steps: the first of a scheme that takes a tolerance (`first_step`), exits over many steps (`within_step`), failing flights in
//!   ever shorter parts (`long_steps`), and a step or a tolerance that is never undercut or has a unit (`bounds`).
//! - Of ends: whether they lie on the path (`events`).
//! - Of fixed steps: one that lands on its exit (`one_step`, `step_errors`), and one after another (`several_steps`, `multistep`).
//! - Each stage by itself, from the state that the solver lists at its start (`stage_by_stage`).

mod bounds;
mod clock;
mod drag;
mod events;
mod first_step;
mod long_steps;
mod multistep;
mod one_step;
mod scaling;
mod several_steps;
mod stage_by_stage;
mod step_errors;
mod within_step;

use self::stage_by_stage::ByStages;
use super::causes::{Cause, Certainty};
use super::fixed_steps::FEW;
use super::questions::Question;
use super::{Asked, Asking, Diagnosis, SYMPTOMS, TOLERANCES, end_of, request};
use crate::exchange::peers::PeerRequest;
use crate::exchange::peers::wire::errors;
use crate::integrators::{Detail, Integrator, Taylor};
use crate::physics::{Problem, Stage, State};
use crate::studies::verdict::Verdict;

/// Failing questions that a solver that has just started is asked again, and the relative difference that makes another answer.
const ALONE: usize = 5;
const ANOTHER: f64 = 1e-9;

/// Order expected of a scheme of fixed steps that claims none.
const LEAST_ORDER: f64 = 2.0;

/// Exits in a row, the impact speed (m/s) there, and the distance between two over the depth.
const EXITS: usize = 24;
const ROW_SPEED: f64 = 100.0;
const BETWEEN_EXITS: f64 = 2e-3;
/// Part of them that must show what is said of steps.
const SHOWN_BY: f64 = 0.75;

/// Part by which numbers differ that are nearly one.
const ONE_PART: f64 = 0.1;
/// Ratios that differ by less are one.
const ONE_RATIO: f64 = 1e-5;

/// Speeds and constant forces of flights to rest.
const RESTS: [(f64, f64); 6] =
    [(10.0, 50.0), (25.0, 70.0), (40.0, 3000.0), (90.0, 200.0), (150.0, 1e4), (300.0, 700.0)];

/// Causes that act in stages of every kind: where only some kinds are wrong, that goes before them.
const OF_EVERY_KIND: [&str; 8] = [
    "clock",
    "exit-late",
    "exit-velocity-late",
    "rest-late",
    "event-time-late",
    "event-time-early",
    "flight-cut-short",
    "steps-too-long",
];

/// Adds what questions made for it show of the solver of `found`, which none of its causes explains with certainty.
pub(super) fn add_measured(asking: &mut Asking<'_>, all: &[Question], found: &mut Diagnosis) {
    let cause = measured(asking, all, found);
    // Where few fail, a formula may be wrong that a scheme does not have.
    let is_of_few =
        |cause: &Cause| cause.certainty != Certainty::Certain && FEW * found.counts.failed < found.counts.asked;
    let is_open = cause.as_ref().is_none_or(|cause| OF_EVERY_KIND.contains(&cause.id.as_str()) || is_of_few(cause));
    let by_stages =
        if is_open && found.counts.failed > 0 { stage_by_stage::measured(asking, all, found) } else { None };
    let measured = cause.as_ref().map(|cause| cause.id.clone());
    if let Some(cause) = cause {
        // A clock is found where events under a constant force are on time; weights make every time late, or early.
        let is_refuted = |known: &str| match cause.id.as_str() {
            "clock" | "weights" => known.starts_with("event-time-"),
            "tolerance-ignored" => known == "single-precision",
            "scheme-coefficient" => known == "drag-lagged",
            _ => false,
        };
        found.causes.retain(|known| !["unknown", "first-order-scheme"].contains(&&*known.id) && !is_refuted(&known.id));
        // What is measured says more of the same.
        found.causes.retain(|known| known.id != cause.id || !SYMPTOMS.contains(&cause.id.as_str()));
        // What is likely, and is no symptom alone, stays first beside what is no more.
        let says_more = |known: &Cause| !SYMPTOMS.contains(&known.id.as_str()) && known.id != "order";
        let stays = |known: &Cause| known.certainty <= cause.certainty && says_more(known);
        let place = usize::from(found.causes.first().is_some_and(stays));
        found.causes.insert(if cause.certainty == Certainty::Certain { 0 } else { place }, cause);
    }
    if let Some(ByStages { cause, is_of_kinds, is_told_apart, shown_by }) = by_stages {
        found.causes.retain(|known| known.id != "unknown" || cause.certainty == Certainty::Possible);
        let is_likely = cause.certainty == Certainty::Likely;
        let acts_everywhere = |known: &Cause| OF_EVERY_KIND.contains(&known.id.as_str());
        let is_of_every_kind = |known: &Cause| acts_everywhere(known) || SYMPTOMS.contains(&known.id.as_str());
        // Steps that are too long are so everywhere.
        let is_of_size = found.causes.first().is_some_and(|known| known.id == "steps-too-long") && is_told_apart;
        let is_of_some = is_of_kinds || found.peer.fixed_step || is_of_size;
        let says_more_than =
            |known: &Cause| is_likely && is_of_some && is_of_every_kind(known) || is_of_kinds && acts_everywhere(known);
        // What acts in stages of every kind does not where only some kinds are wrong.
        if is_of_kinds {
            for known in found.causes.iter_mut().filter(|known| acts_everywhere(known)) {
                known.certainty = known.certainty.max(Certainty::Possible);
            }
        }
        // One that explains half as many questions, or fewer, says less, and so does one that fits a single answer.
        let explains_few = |known: &Cause| {
            known.certainty == cause.certainty
                && is_likely
                && known.id != "steps-too-long"
                && (is_of_kinds || !is_of_every_kind(known) || measured.as_ref() != Some(&known.id))
                && (2 * known.explains <= cause.explains || known.explains == 1 && shown_by > 1)
        };
        let goes_behind =
            |known: &Cause| known.certainty > cause.certainty || says_more_than(known) || explains_few(known);
        let place = usize::from(found.causes.first().is_some_and(|known| !goes_behind(known)));
        found.causes.insert(place, cause);
    }
}

/// Puts a wrong weight of a scheme of several steps in place of a factor of the time: where the weights of x and V add up to another number
/// than one, the path is right, in another time.
pub(super) fn add_weights(asking: &mut Asking<'_>, found: &mut Diagnosis) {
    if found.peer.fixed_step
        && found.causes.first().is_some_and(|cause| cause.id == "unit:time")
        && let Some(cause) = several_steps::changed(asking)
    {
        found.causes = vec![cause];
    }
}

/// What questions made for it show of the solver of `found`.
pub(super) fn measured(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
    let anew = kept(asking, all, found);
    if anew.is_some() || asking.reads_scene {
        return anew;
    }
    if found.peer.fixed_step {
        // Where the limit is wrong, so is the force, and the step tells nothing of the scheme but what no force explains.
        if FEW * found.counts.failed > found.counts.asked {
            return several_steps::changed(asking);
        }
        let claimed = found.orders.iter().filter_map(|order| order.formal_order).reduce(f64::max);
        let claimed = claimed.unwrap_or(LEAST_ORDER);
        if let Some(cause) = several_steps::iteration(asking, claimed) {
            return Some(cause);
        }
        let steps = several_steps::unlike_the_first(asking, several_steps::NEARER);
        return steps
            .as_ref()
            .and_then(|steps| several_steps::measured(steps, claimed))
            .or_else(|| one_step::measured(asking, claimed))
            .or_else(|| step_errors::measured(asking, claimed))
            .or_else(|| several_steps::later(steps.as_ref()?, claimed))
            .or_else(|| within_step::measured(asking, true))
            .or_else(|| step_errors::later(asking, claimed));
    }
    clock::measured(asking, all, found)
        .or_else(|| clock::weights(asking))
        .or_else(|| drag::measured(asking))
        .or_else(|| scaling::measured(asking, all, found))
        .or_else(|| clock::cut_short(asking))
        .or_else(|| events::straight(asking))
        .or_else(|| within_step::measured(asking, false))
        .or_else(|| first_step::measured(asking))
        .or_else(|| events::straight_to_rest(asking))
        .or_else(|| bounds::absolute_tolerance(asking))
        .or_else(|| bounds::least_step(asking))
        .or_else(|| bounds::least_tolerance(asking))
        .or_else(|| bounds::smooth_floor(asking, found))
        .or_else(|| clock::one_rate(found))
        .or_else(|| events::beside(all, found))
        .or_else(|| long_steps::measured(asking, all, found))
}

/// Whether failing questions are answered otherwise by a solver that has just started: then it keeps something of earlier ones,
/// or gives no answer twice.
fn kept(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
    let failing: Vec<&Asked> =
        found.questions.iter().filter(|row| row.verdict == Verdict::Failed && row.answered.is_some()).collect();
    let (mut other, mut unlike, mut asked) = (0, 0, 0);
    for row in failing.iter().step_by((failing.len() / ALONE).max(1)).take(ALONE) {
        let (Some(question), Some(before)) = (all.iter().find(|question| question.id == row.id), row.answered) else {
            continue;
        };
        let again = PeerRequest { dt_s: row.dt_s, ..request(question, row.rtol.unwrap_or(TOLERANCES[0])) };
        let mut of_a_new_one = || {
            let is_there = !asking.is_gone && asking.solver.restart();
            is_there.then(|| asking.ask(&again).ok()).flatten().map(|answer| end_of(&answer).state)
        };
        let (Some(one), Some(two)) = (of_a_new_one(), of_a_new_one()) else { continue };
        let differs = |a, b| errors(a, b, question.problem.impact_speed).iter().any(|apart| !(apart.abs() <= ANOTHER));
        asked += 1;
        other += usize::from(differs(one, before.state));
        unlike += usize::from(differs(one, two));
    }
    let said = format!("{other} of {asked} failing questions");
    let certainty = if other == asked { Certainty::Certain } else { Certainty::Likely };
    match (other, unlike) {
        (2.., 0) => {
            let statement = format!(
                "answers depend on what was asked before: {said} are answered otherwise by a solver that has just started"
            );
            Some(Cause::plain("state-kept", statement, certainty, other, asked))
        }
        (2.., _) => {
            let statement =
                format!("answers are not the same twice: {said} are answered otherwise when they are asked again");
            Some(Cause::plain("not-repeatable", statement, certainty, other, asked))
        }
        _ => None,
    }
}

/// The end of the flight through `problem` as the solver has it, asked by `request`, and the exact one.
fn ends(asking: &mut Asking<'_>, problem: &Problem, request: &PeerRequest) -> Option<[State; 2]> {
    if asking.is_gone {
        return None;
    }
    let exact = Taylor::default().solve(problem, Detail::End).ok()?;
    let answer = asking.ask(request).ok()?;
    answer.outcome.agrees_with(exact.outcome).then(|| [end_of(&answer).state, exact.end])
}

/// Exits in a row, found and exact, by one absolute tolerance.
fn row_of_exits(asking: &mut Asking<'_>) -> Option<Vec<[State; 2]>> {
    let of_depth = |depth| Problem::of_stages(1.0, ROW_SPEED, [Stage::tunnel(500.0, 0.5)]).with_exit(depth);
    // Else each flight has steps of its own.
    let atol = PeerRequest::from_problem(&of_depth(1.0), TOLERANCES[0]).atol;
    (0..EXITS)
        .map(|index| {
            let problem = of_depth(1.0 + BETWEEN_EXITS * index as f64);
            let request = PeerRequest { atol, ..PeerRequest::from_problem(&problem, TOLERANCES[0]) };
            ends(asking, &problem, &request)
        })
        .collect()
}

/// The largest relative error of `found`.
fn off(found: State, exact: State, impact_speed: f64) -> f64 {
    errors(found, exact, impact_speed).iter().fold(0.0, |worst, error| worst.max(error.abs()))
}
