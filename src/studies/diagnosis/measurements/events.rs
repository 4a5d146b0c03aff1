//! Where does the end of a flight lie: on the path, on a straight line through a step, or on the path a little before or behind it?

use super::super::causes::{Cause, Certainty};
use super::super::questions::Question;
use super::super::simulation::continued;
use super::super::{ALLOWED, Asked, Asking, Diagnosis, TOLERANCES};
use super::{EXITS, ONE_PART, RESTS, SHOWN_BY, ends, row_of_exits};
use crate::exchange::peers::PeerRequest;
use crate::exchange::peers::wire::errors;
use crate::physics::{Outcome, Problem, Stage, State};
use crate::studies::verdict::Verdict;

/// Second differences over the right ones that are none.
const STRAIGHT: f64 = 1e-3;

/// Whether time and velocity run along a straight line within a step.
pub(super) fn straight(asking: &mut Asking<'_>) -> Option<Cause> {
    let flights = row_of_exits(asking)?;
    let part = |holds: &dyn Fn(&[[State; 2]]) -> bool| {
        flights.windows(3).filter(|three| holds(three)).count() as f64 >= SHOWN_BY * (EXITS - 2) as f64
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
pub(super) fn straight_to_rest(asking: &mut Asking<'_>) -> Option<Cause> {
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

/// Whether time and velocity at exits are those of the right flight a little before or behind it, and the depth is that of the exit.
pub(super) fn beside(all: &[Question], found: &Diagnosis) -> Option<Cause> {
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
