//! Is it the time that is wrong, where the path is right: a clock that goes on otherwise than the steps, rates with one factor,
//! a flight that is cut short?

use super::super::causes::{Cause, Certainty};
use super::super::questions::Question;
use super::super::{ALLOWED, Asking, Diagnosis, Each, TOLERANCES, request};
use super::{ALONE, EXITS, ONE_PART, ONE_RATIO, RESTS, ROW_SPEED, SHOWN_BY, ends, off, row_of_exits};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage, State};
use crate::studies::verdict::Verdict;

/// Part by which times of two exits within a step differ otherwise than the right ones.
const ALONG: f64 = 0.02;
/// The same at most, where they change smoothly.
const SMOOTH: f64 = 0.5;
/// Error of the time between two exits over that of the path, at least, where the time is summed otherwise.
const OF_PATH: f64 = 100.0;
/// Part of its distance from one by which the factor of coasting may differ under drag.
const BRAKED_PART: f64 = 0.25;

/// Whether the time alone is wrong, and by what stays the same within a step: the clock then goes on otherwise than the steps do.
pub(super) fn measured(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
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
    if far >= SHOWN_BY * rises.len() as f64 && smooth >= SHOWN_BY * rises.len() as f64 {
        // At one speed every rule is right.
        let coasting = Problem::of_stages(1.0, ROW_SPEED, [Stage::free()]).with_exit(1.0);
        let at_one_speed = ends(asking, &coasting, &PeerRequest::from_problem(&coasting, TOLERANCES[0]))?;
        if is_wrong(&at_one_speed) {
            return said(
                "the time alone is wrong, also where there is no force, and changes smoothly from exit to exit: the clock goes on by other \
                 lengths than those of the steps",
            );
        }
        return said(
            "the time alone is wrong, and changes smoothly from exit to exit: it is summed over the steps by a rule of a lower order than \
             that of the path",
        );
    }
    (along >= SHOWN_BY * rises.len() as f64).then_some(())?;
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

/// Whether depth grows by `V t` where there is no force: else the weights of the scheme do not add up to one.
pub(super) fn weights(asking: &mut Asking<'_>) -> Option<Cause> {
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
pub(super) fn one_rate(found: &Diagnosis) -> Option<Cause> {
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

/// Whether the time at an exit is a number above one times its depth over V0, whatever the force; one is that of a formula.
pub(super) fn cut_short(asking: &mut Asking<'_>) -> Option<Cause> {
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
