//! What does a solver do, as questions made for it measure? Asked where no known fault explains its answers with certainty.
//!
//! - Asked anew: whether a solver that has just started gives other answers.
//! - The drag, speed by speed: a short flight through drag alone loses `ln(V0/V) = Q H / M` whatever the speed, so that
//!   the ratio of the loss to that is the ratio of the force.
//! - How each term alone grows with mass, speed, depth and its coefficient (`scaling`).
//! - Exits that lie close to each other, within one step: where the step is replaced by a straight line, so are the time
//!   and the velocity as functions of the depth, and their second differences vanish.
//! - The same flight with other units of length and speed: the relative error of a solver whose tolerance is relative
//!   stays, and that of one with an absolute tolerance of its own falls as the numbers grow.
//! - The first step of a scheme that takes a tolerance (`first_step`), and exits over many of its steps (`within_step`).
//! - One flight in ever shorter times, and at ever tighter tolerances: a step or a tolerance that is never undercut (`bounds`).
//! - Failing flights in ever shorter parts (`long_steps`).
//! - What the answers that came show of clocks, of rates that have one factor, and of ends that are those of a moment beside them.
//! - One step of a scheme, of fixed steps, that lands on its exit (`one_step`), and one after another (`several_steps`).
//! - Each stage by itself, from the state that the solver lists at its start (`stage_by_stage`).

mod bounds;
mod first_step;
mod long_steps;
mod one_step;
mod scaling;
mod several_steps;
mod stage_by_stage;
mod within_step;

use self::stage_by_stage::ByStages;
use super::causes::{Cause, Certainty};
use super::fixed_steps::FEW;
use super::questions::Question;
use super::simulation::continued;
use super::{ALLOWED, Asked, Asking, Diagnosis, Each, SYMPTOMS, TOLERANCES, end_of, request};
use crate::exchange::peers::PeerRequest;
use crate::exchange::peers::wire::errors;
use crate::integrators::{Detail, Integrator, Taylor};
use crate::physics::{Outcome, Problem, Stage, State};
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
/// Part by which numbers differ that are nearly one.
const ONE_PART: f64 = 0.1;
/// Part by which times of two exits within a step differ otherwise than the right ones.
const ALONG: f64 = 0.02;
/// The same at most, where they change smoothly.
const SMOOTH: f64 = 0.5;
/// Error of the time between two exits over that of the path, at least, where the time is summed otherwise.
const OF_PATH: f64 = 100.0;
/// Second differences over the right ones that are none, and the part of them that must be none.
const STRAIGHT: f64 = 1e-3;
const STRAIGHT_PART: f64 = 0.75;

/// Speeds at which the drag is measured: powers of ten, and how many in each decade.
const DECADES: [i32; 2] = [-1, 3];
const IN_A_DECADE: i32 = 4;
/// `ln(V0/V)` of the flights that measure it.
const LOSS: f64 = 0.01;
/// Speeds at which a constant force must be right beside it.
const BESIDE: [f64; 4] = [0.37, 5.3, 81.9, 1234.5];
/// Ratios that differ by less are one.
const ONE_RATIO: f64 = 1e-5;
/// Part of its distance from one by which the factor of coasting may differ under drag.
const BRAKED_PART: f64 = 0.25;
/// Halvings of a bracket in which the ratio changes.
const HALVINGS: usize = 24;

/// Speeds and constant forces of flights to rest.
const RESTS: [(f64, f64); 6] =
    [(10.0, 50.0), (25.0, 70.0), (40.0, 3000.0), (90.0, 200.0), (150.0, 1e4), (300.0, 700.0)];

/// Factors of length and speed, powers of two.
const SIZES: [f64; 4] = [1.0 / 1024.0, 1.0 / 32.0, 1.0, 32.0];
/// By how much the error falls at least from one size to the next, and from the first to the last.
const FALLS: f64 = 3.0;
const FALLS_IN_ALL: f64 = 1e3;
/// Part by which a fall of the error with the size differs from the ratio of sizes.
const SAME_FALL: f64 = 0.05;

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
        let is_of_every_kind = |known: &Cause| OF_EVERY_KIND.iter().chain(&SYMPTOMS).any(|id| *id == known.id);
        // Steps that are too long are so everywhere.
        let is_of_size = found.causes.first().is_some_and(|known| known.id == "steps-too-long") && is_told_apart;
        let says_more = is_of_kinds || (found.peer.fixed_step || is_of_size) && cause.certainty == Certainty::Likely;
        // What acts in stages of every kind does not where only some kinds are wrong.
        if is_of_kinds {
            for known in found.causes.iter_mut().filter(|known| OF_EVERY_KIND.contains(&known.id.as_str())) {
                known.certainty = known.certainty.max(Certainty::Possible);
            }
        }
        // One that explains half as many questions, or fewer, says less, and so does one that fits a single answer.
        let explains_few = |known: &Cause| {
            known.certainty == cause.certainty
                && cause.certainty == Certainty::Likely
                && known.id != "steps-too-long"
                && (is_of_kinds || !is_of_every_kind(known) || measured.as_ref() != Some(&known.id))
                && (2 * known.explains <= cause.explains || known.explains == 1 && shown_by > 1)
        };
        let goes_behind = |known: &Cause| {
            known.certainty > cause.certainty || says_more && is_of_every_kind(known) || explains_few(known)
        };
        let place = usize::from(found.causes.first().is_some_and(|known| !goes_behind(known)));
        found.causes.insert(place, cause);
    }
}

/// What questions made for it show of the solver of `found`.
pub(super) fn measured(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
    let anew = kept(asking, all, found);
    if anew.is_some() || asking.reads_scene {
        return anew;
    }
    if found.peer.fixed_step {
        // Where the limit is wrong, so is the force, and the step tells nothing of the scheme.
        if FEW * found.counts.failed > found.counts.asked {
            return None;
        }
        let claimed = found.orders.iter().filter_map(|order| order.formal_order).reduce(f64::max);
        let claimed = claimed.unwrap_or(LEAST_ORDER);
        return several_steps::measured(asking, claimed)
            .or_else(|| one_step::measured(asking, claimed))
            .or_else(|| within_step::measured(asking, true));
    }
    clock(asking, all, found)
        .or_else(|| coasting(asking))
        .or_else(|| drag_by_speed(asking))
        .or_else(|| scaling::measured(asking, all, found))
        .or_else(|| cut_short(asking))
        .or_else(|| straight_steps(asking))
        .or_else(|| within_step::measured(asking, false))
        .or_else(|| first_step::measured(asking))
        .or_else(|| straight_to_rest(asking))
        .or_else(|| absolute_tolerance(asking))
        .or_else(|| bounds::least_step(asking))
        .or_else(|| bounds::least_tolerance(asking))
        .or_else(|| bounds::smooth_floor(asking, found))
        .or_else(|| one_rate(found))
        .or_else(|| loose_ends(all, found))
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

/// Whether the time alone is wrong, and by what stays the same within a step: the clock then goes on otherwise than the steps do.
fn clock(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
    let failing = found.questions.iter().filter(|row| row.verdict == Verdict::Failed);
    let errors_of: Vec<[Each; 2]> = failing.filter_map(|row| Some([row.relative_error?, row.limit?])).collect();
    let of_time = |[error, limit]: &&[Each; 2]| {
        let is_of_time = error.depth.abs() <= limit.depth && error.velocity.abs() <= limit.velocity;
        is_of_time && error.time.abs() > limit.time
    };
    let alone: Vec<_> = errors_of.iter().filter(of_time).collect();
    let late = alone.iter().filter(|[error, _]| error.time > 0.0).count();
    let of = found.counts.failed;
    if alone.is_empty() || 10 * alone.len() < 9 * of {
        return None;
    }
    // Steps are rejected wherever the force changes: where few questions fail, a formula is wrong, unless its error follows the steps.
    if 2 * of < found.counts.asked && !follows_steps(asking, all, found) {
        return None;
    }
    let is_right = |asking: &mut Asking<'_>, (speed, force): (f64, f64)| {
        let problem = Problem::of_stages(1.0, speed, [Stage::tunnel(force, 0.0)]);
        let to_rest = 0.5 * speed * speed / force;
        [problem.clone(), problem.with_exit(0.7 * to_rest)].iter().all(|problem| {
            ends(asking, problem, &PeerRequest::from_problem(problem, TOLERANCES[0]))
                .is_some_and(|[found, exact]| off(found, exact, speed) <= TOLERANCES[1])
        })
    };
    let said = |statement: &str| Some(Cause::plain("clock", statement.to_owned(), Certainty::Likely, alone.len(), of));
    if 10 * late >= 9 * of && RESTS.into_iter().all(|flight| is_right(asking, flight)) {
        return said(
            "the time alone is wrong, and late, and under a constant force it is right: the clock goes on in steps that are rejected",
        );
    }
    let flights = row_of_exits(asking)?;
    let is_wrong = |[found, exact]: &[State; 2]| (found.time / exact.time - 1.0).abs() > ALLOWED * TOLERANCES[0];
    // The time at an end of a step would be the same at each exit within it.
    let over_right = |pair: &[[State; 2]]| {
        let rise = |which: usize| pair[1][which].time - pair[0][which].time;
        rise(0) / rise(1) - 1.0
    };
    let rises: Vec<f64> = flights.windows(2).map(over_right).collect();
    let along = rises.iter().filter(|rise| rise.abs() <= ALONG).count() as f64;
    let most = rises.iter().fold(0.0_f64, |most, rise| most.max(rise.abs()));
    // Behind the end of a step it begins anew.
    let is_smooth = |pair: &&[f64]| (pair[1] - pair[0]).abs() <= ONE_PART * most && pair[0].abs() <= SMOOTH;
    let smooth = rises.windows(2).filter(is_smooth).count() as f64;
    if !flights.iter().any(is_wrong) {
        return None;
    }
    // Beside the error of the path a time that is summed otherwise is far off.
    let of_path =
        flights.iter().map(|[found, exact]| (found.velocity - exact.velocity).abs()).fold(0.0, f64::max) / ROW_SPEED;
    let far = rises.iter().filter(|rise| rise.abs() > OF_PATH * of_path).count() as f64;
    if far >= STRAIGHT_PART * rises.len() as f64 && smooth >= STRAIGHT_PART * rises.len() as f64 {
        return said(
            "the time alone is wrong, and changes smoothly from exit to exit: it is summed over the steps by a rule of a lower order than \
             that of the path",
        );
    }
    (along >= STRAIGHT_PART * rises.len() as f64).then_some(())?;
    said(
        "the time alone is wrong, by what stays the same from exit to exit within a step: the clock goes on by another length than that \
         of the step",
    )
}

/// Whether times of failing questions differ from tolerance to tolerance.
fn follows_steps(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> bool {
    let failing = found.questions.iter().filter(|row| row.verdict == Verdict::Failed);
    let failing: Vec<&Question> =
        failing.filter_map(|row| all.iter().find(|question| question.id == row.id)).take(ALONE).collect();
    let mut moves = |question: &&&Question| {
        let mut at = |rtol| Some(ends(asking, &question.problem, &request(question, rtol))?[0].time);
        let times = [TOLERANCES[0], TOLERANCES[2]].map(&mut at);
        let exact = question.exact.end.time;
        matches!(times, [Some(loose), Some(tight)] if (loose - tight).abs() > ALONG * (tight - exact).abs())
    };
    let moved = failing.iter().filter(&mut moves).count();
    2 * moved > failing.len()
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

/// Whether depth grows by `V t` where there is no force: else the weights of the scheme do not add up to one.
fn coasting(asking: &mut Asking<'_>) -> Option<Cause> {
    // Right times over those of the answers, and whether the velocity is right.
    let mut ratio = |speed: f64, depth: f64, drag: f64, rtol: f64| {
        let problem = Problem::of_stages(1.0, speed, [Stage::tunnel(0.0, drag)]).with_exit(depth);
        let [found, exact] = ends(asking, &problem, &PeerRequest::from_problem(&problem, rtol))?;
        Some((exact.time / found.time, found.velocity == exact.velocity))
    };
    let mut without = |(speed, depth), rtol| ratio(speed, depth, 0.0, rtol).filter(|(_, is_right)| *is_right);
    let flights = [(1.0, 1.0), (30.0, 2.0), (700.0, 0.1)];
    let all = TOLERANCES.into_iter().flat_map(|rtol| flights.map(|flight| (flight, rtol)));
    let ratios: Vec<(f64, bool)> = all.map(|(flight, rtol)| without(flight, rtol)).collect::<Option<_>>()?;
    let factor = ratios[0].0;
    // A step under drag is as short as the tolerance has it, and one wrong step does not count there.
    let (braked, _) = ratio(1.0, 1.0, 1.0, TOLERANCES[2])?;
    let is_one = |ratio: f64, part: f64| (ratio - factor).abs() <= part * (factor - 1.0).abs();
    let is_of_all = ratios.iter().all(|(ratio, _)| is_one(*ratio, ONE_RATIO)) && is_one(braked, BRAKED_PART);
    let statement = format!(
        "without a force x grows by {factor:.6} V t: dx/dt = V has a factor, or the weights of the scheme add up to that"
    );
    let cause = Cause::plain("weights", statement, Certainty::Likely, ratios.len(), ratios.len());
    ((factor - 1.0).abs() > ONE_RATIO && is_of_all).then_some(Cause { factor: Some(factor), ..cause })
}

/// Whether the time is off by nearly one part of it, and the path hardly is: all rates then have a factor.
fn one_rate(found: &Diagnosis) -> Option<Cause> {
    // Of all steps, whatever their length.
    if found.causes.first().is_none_or(|known| known.id != "tolerance-ignored") {
        return None;
    }
    let failing = found.questions.iter().filter(|row| row.verdict == Verdict::Failed);
    let errors_of: Vec<Each> = failing.filter_map(|row| row.relative_error).collect();
    let mut times: Vec<f64> = errors_of.iter().map(|error| error.time).collect();
    times.sort_by(f64::total_cmp);
    let part = *times.get(times.len() / 2)?;
    let is_of_it =
        |error: &&Each| (error.time - part).abs() <= ONE_PART * part.abs() && error.depth.abs() <= 0.5 * part.abs();
    let (seen, of) = (errors_of.iter().filter(is_of_it).count(), found.counts.failed);
    let statement = format!(
        "the time is off by nearly one part of it, {part:+.1e}, and the path by less: x and V change by {:.7} of their rates, as where the \
         weights of the scheme add up to that",
        1.0 / (1.0 + part)
    );
    let cause = Cause::plain("weights", statement, Certainty::Likely, seen, of);
    (2 * seen >= of && 2 * of >= found.counts.asked).then_some(Cause { factor: Some(1.0 / (1.0 + part)), ..cause })
}

/// Whether time and velocity at exits are those of the right flight a little before or behind it, and the depth is that of the exit.
fn loose_ends(all: &[Question], found: &Diagnosis) -> Option<Cause> {
    let failing = found.questions.iter().filter(|row| row.verdict == Verdict::Failed);
    let on_path = |row: &Asked| {
        let question = all.iter().find(|question| question.id == row.id)?;
        let (exact, speed, found) = (&question.exact, question.problem.impact_speed, row.answered?);
        let off = found.state.velocity - exact.end.velocity;
        let is_telling = exact.outcome == Outcome::Perforated && found.outcome == exact.outcome && exact.stage == 0;
        if !is_telling || off.abs() <= row.limit?.velocity * speed {
            return None;
        }
        let there = continued(&question.problem, exact.stage, exact.end, found.state.time - exact.end.time)?;
        Some((found.state.velocity - there.velocity).abs() <= ONE_PART * off.abs())
    };
    let told: Vec<bool> = failing.filter_map(on_path).collect();
    let seen = told.iter().filter(|is| **is).count();
    let statement = "time and velocity at an exit are those of a moment a little before or behind it: the end is not located as accurately \
                     as steps are taken"
        .to_owned();
    (seen >= RESTS.len() && 10 * seen >= 9 * told.len())
        .then(|| Cause::plain("event-loose", statement, Certainty::Likely, seen, told.len()))
}

/// The largest relative error of `found`.
fn off(found: State, exact: State, impact_speed: f64) -> f64 {
    errors(found, exact, impact_speed).iter().fold(0.0, |worst, error| worst.max(error.abs()))
}

/// Whether the drag is a factor times the right one that depends on the speed.
fn drag_by_speed(asking: &mut Asking<'_>) -> Option<Cause> {
    // The ratio at a speed, if answers at two tolerances agree on it.
    let mut of_stage = |speed: f64, stage: Stage| {
        let problem = Problem::of_stages(1.0, speed, [stage]).with_exit(1.0);
        let mut at = |rtol| {
            let [found, exact] = ends(asking, &problem, &PeerRequest::from_problem(&problem, rtol))?;
            Some((speed / found.velocity).ln() / (speed / exact.velocity).ln())
        };
        let (looser, tighter) = (at(TOLERANCES[1])?, at(TOLERANCES[2])?);
        ((looser - tighter).abs() <= 0.1 * (tighter - 1.0).abs() + ONE_RATIO).then_some(tighter)
    };
    let is_one = |a: f64, b: f64| (a - b).abs() <= ONE_RATIO * a.abs().max(b.abs()).max(1.0);
    // A speed that is read or reported wrongly shows under any force.
    let mut is_right = |speed: &f64| {
        let same_loss = Stage::tunnel(LOSS * speed * speed, 0.0);
        of_stage(*speed, same_loss).is_some_and(|ratio| is_one(ratio, 1.0))
    };
    if !BESIDE.iter().all(&mut is_right) {
        return None;
    }
    let mut ratio = |speed: f64| of_stage(speed, Stage::tunnel(0.0, LOSS));
    let speeds = (DECADES[0] * IN_A_DECADE..=DECADES[1] * IN_A_DECADE)
        .map(|power| 10f64.powf(f64::from(power) / f64::from(IN_A_DECADE)));
    let count = speeds.clone().count();
    let ratios: Vec<(f64, f64)> = speeds.filter_map(|speed| Some((speed, ratio(speed)?))).collect();
    if 4 * ratios.len() < 3 * count {
        return None;
    }
    if ratios.iter().all(|(_, ratio)| is_one(*ratio, 1.0)) {
        return None;
    }
    let off = ratios.iter().filter(|(_, ratio)| !is_one(*ratio, 1.0)).count();
    let of = ratios.len();
    let likely =
        |factor, statement| Some(Cause { factor, ..Cause::plain("term:drag", statement, Certainty::Likely, off, of) });
    let [(_, low), .., (_, high)] = ratios[..] else { return None };
    let below = ratios.iter().take_while(|(_, ratio)| is_one(*ratio, low)).count();
    let above = ratios.iter().rev().take_while(|(_, ratio)| is_one(*ratio, high)).count();
    let said =
        |ratio: f64| if is_one(ratio, 1.0) { "right".to_owned() } else { format!("{ratio:.6} times the right one") };
    // All these flights are one but for their unit of time: one ratio for all is that of any error.
    if below == ratios.len() {
        return None;
    }
    // One flight may pass the change on its way.
    if below + above + 1 >= ratios.len() {
        let (mut slow, mut fast) = (ratios[below - 1].0, ratios[below].0);
        for _ in 0..HALVINGS {
            let middle = (slow * fast).sqrt();
            // A step over the change may err at one tolerance and not at the other.
            if ratio(middle).is_some_and(|ratio| is_one(ratio, low)) { slow = middle } else { fast = middle }
        }
        let factor = if is_one(low, 1.0) { high } else { low };
        let statement = format!("the drag is {} above {fast:.4} m/s, and {} below", said(high), said(low));
        return likely(Some(factor), statement);
    }
    let worst = ratios.iter().copied().max_by(|a, b| (a.1 - 1.0).abs().total_cmp(&(b.1 - 1.0).abs()))?;
    let listed = [ratios[0], ratios[ratios.len() / 2], ratios[ratios.len() - 1], worst];
    let [a, b, c, worst] = listed.map(|(speed, ratio)| format!("{ratio:.6} at {speed:.4} m/s"));
    likely(None, format!("the drag is not q V²: over the right one it is {a}, {b} and {c}; most off is {worst}"))
}

/// Whether the time at an exit is a number above one times its depth over V0, whatever the force; one is that of a formula.
fn cut_short(asking: &mut Asking<'_>) -> Option<Cause> {
    let over_straight = |[found, _]: &[State; 2]| ROW_SPEED * found.time / found.depth;
    let row = row_of_exits(asking)?;
    let factor = over_straight(row.first()?);
    let is_one = |ends: &[State; 2]| (over_straight(ends) - factor).abs() <= ONE_RATIO * factor;
    let problem = Problem::of_stages(1.0, ROW_SPEED, [Stage::tunnel(700.0, 0.6)]).with_exit(1.0);
    let of_more_force = ends(asking, &problem, &PeerRequest::from_problem(&problem, TOLERANCES[0]))?;
    let statement = format!(
        "the time at an exit is {factor:.6} times its depth over V0, whatever the force: the flight is cut short there"
    );
    let cause = Cause::plain("flight-cut-short", statement, Certainty::Likely, EXITS + 1, EXITS + 1);
    let is_longer = factor > 1.0 + ONE_RATIO;
    (is_longer && is_one(&of_more_force) && row.iter().all(is_one)).then_some(Cause { factor: Some(factor), ..cause })
}

/// Whether time and velocity run along a straight line within a step.
fn straight_steps(asking: &mut Asking<'_>) -> Option<Cause> {
    let flights = row_of_exits(asking)?;
    let part = |holds: &dyn Fn(&[[State; 2]]) -> bool| {
        flights.windows(3).filter(|three| holds(three)).count() as f64 >= STRAIGHT_PART * (EXITS - 2) as f64
    };
    let rise = |three: &[[State; 2]], of: fn(&State) -> f64, which: usize| of(&three[2][which]) - of(&three[0][which]);
    let velocity: fn(&State) -> f64 = |state| state.velocity;
    // One that has come to rest does so too.
    let is_same = |three: &[[State; 2]]| {
        three[1][0].velocity > 0.0 && rise(three, velocity, 0).abs() <= STRAIGHT * rise(three, velocity, 1).abs()
    };
    if part(&is_same) {
        let [found, exact] = flights[EXITS / 2];
        let (id, end) =
            if found.velocity > exact.velocity { ("velocity-stale", "start") } else { ("exit-velocity-late", "end") };
        let statement = format!("V is the same at every exit within a step: that of the {end} of the step");
        // So would a speed that is rounded be.
        return Some(Cause::plain(id, statement, Certainty::Likely, EXITS, EXITS));
    }
    let is_straight = |of: fn(&State) -> f64| {
        part(&|three| {
            let bend = |which: usize| of(&three[0][which]) - 2.0 * of(&three[1][which]) + of(&three[2][which]);
            let goes_along = 2.0 * rise(three, of, 0).abs() >= rise(three, of, 1).abs();
            goes_along && bend(0).abs() <= STRAIGHT * bend(1).abs()
        })
    };
    let what = match (is_straight(|state| state.time), is_straight(|state| state.velocity)) {
        (true, true) => "time and velocity at the exit are",
        (true, false) => "the time at the exit is",
        (false, true) => "the velocity at the exit is",
        (false, false) => return None,
    };
    let statement = format!("{what} taken from a straight line through a step, its chord or a tangent");
    Some(Cause::plain("event-straight", statement, Certainty::Certain, EXITS, EXITS))
}

/// Whether the depth at rest lies on a chord: under a constant force V is a straight line itself, so that the time of rest is right.
fn straight_to_rest(asking: &mut Asking<'_>) -> Option<Cause> {
    let mut errors_of = |problem: &Problem| {
        let [found, exact] = ends(asking, problem, &PeerRequest::from_problem(problem, TOLERANCES[0]))?;
        Some(errors(found, exact, problem.impact_speed))
    };
    let to_rest = |(speed, force): (f64, f64)| Problem::of_stages(1.0, speed, [Stage::tunnel(force, 0.0)]);
    let all: Vec<[f64; 3]> = RESTS.map(|flight| errors_of(&to_rest(flight))).into_iter().collect::<Option<_>>()?;
    // Steps that are wrong themselves are so on the way too.
    let halfway = |(speed, force): (f64, f64)| to_rest((speed, force)).with_exit(0.25 * speed * speed / force);
    let on_the_way: Vec<[f64; 3]> =
        RESTS.map(|flight| errors_of(&halfway(flight))).into_iter().collect::<Option<_>>()?;
    if on_the_way.iter().flatten().any(|error| error.abs() > ALLOWED * TOLERANCES[0]) {
        return None;
    }
    let is_right = |[_, time, velocity]: &[f64; 3]| time.abs() <= TOLERANCES[1] && *velocity == 0.0;
    let is_short = |[depth, ..]: &[f64; 3]| *depth < -ALLOWED * TOLERANCES[1];
    let short = all.iter().filter(|errors| is_short(errors)).count();
    let statement = "the depth at rest is taken from a straight line through a step: under a constant force its time \
                     is right and it is too small";
    (all.iter().all(is_right) && 4 * short >= 3 * all.len())
        .then(|| Cause::plain("event-straight", statement.to_owned(), Certainty::Likely, short, all.len()))
}

/// Whether the error falls as lengths and speeds grow, at one relative tolerance.
fn absolute_tolerance(asking: &mut Asking<'_>) -> Option<Cause> {
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
