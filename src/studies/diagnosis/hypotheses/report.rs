//! Faults of the report: the flight is right, and a number of its end is not.

use super::super::simulation::{Simulated, continued};
use super::{Change, DIGITS, GRAINS, Hypothesis, Parameter, of, to_digits, to_grain, to_single};
use crate::physics::{Problem, State};

fn shift_time(found: &mut Simulated, by: f64) {
    found.end.time += by;
}

/// The last end of a stage before the stage of the end.
pub(super) fn last_end(found: &Simulated) -> Option<State> {
    found.passed.iter().rev().find(|(index, _)| *index < found.stage).map(|(_, state)| *state)
}

/// The end of the first stage, where the flight passes it.
fn first_end(found: &Simulated) -> Option<State> {
    found.passed.iter().find(|(index, _)| *index == 0 && found.stage > 0).map(|(_, state)| *state)
}

/// The velocity at the exit altered, by itself and the impact speed.
fn of_exit(problem: &Problem, found: &mut Simulated, alter: impl Fn(f64, f64) -> f64) {
    if found.end.depth >= problem.exit_depth {
        found.end.velocity = alter(found.end.velocity, problem.impact_speed);
    }
}

/// The start and the end of the flight through each stage.
fn legs(problem: &Problem, found: &Simulated) -> impl Iterator<Item = [State; 2]> {
    let ends = found.passed.iter().filter(|(index, _)| *index < found.stage).map(|(_, state)| *state);
    let all: Vec<State> = std::iter::once(State::at_impact(problem)).chain(ends).chain([found.end]).collect();
    (1..all.len()).map(move |index| [all[index - 1], all[index]])
}

/// Numbers of the end that are rounded.
pub(super) static ROUNDED: [[Hypothesis; 4]; 3] = [
    rounded!("output-rounded", "the depth reported", "m", Report(_, found; n) found.end.depth),
    rounded!("output-rounded", "the time reported", "s", Report(_, found; n) found.end.time),
    rounded!("output-rounded", "the velocity reported", "m/s", Report(_, found; n) found.end.velocity),
];

/// Numbers of the end that are bounded.
pub(super) static BOUNDED: [[Hypothesis; 2]; 3] = [
    bounded!("output-clipped", "the depth reported", "m", 0.1, Report(_, found; n) found.end.depth),
    bounded!("output-clipped", "the time reported", "s", 0.01, Report(_, found; n) found.end.time),
    bounded!("output-clipped", "the velocity reported", "m/s", 30.0, Report(_, found; n) found.end.velocity),
];

/// Faults of the report.
pub(super) static FAULTS: &[Hypothesis] = &[
    of("outcome-name", "the numbers are right, and the outcome named is not", Parameter::None, &[]),
    of(
        "exit-velocity-stale",
        "the velocity reported at the exit is that of the last end of a stage",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            if found.end.depth >= p.exit_depth
                && let Some(state) = last_end(found)
            {
                found.end.velocity = state.velocity;
            }
        })],
    ),
    of(
        "event-time-late",
        "only the time is wrong, and late, as that of the end of a step",
        Parameter::Lateness,
        &[Change::Report(|_, found, late| shift_time(found, late))],
    ),
    of(
        "event-time-early",
        "only the time is wrong, and early, as that of the start of a step, or a sum that is not fine enough",
        Parameter::Lateness,
        &[Change::Report(|_, found, late| shift_time(found, -late))],
    ),
    of(
        "time-restarts",
        "time starts anew at the end of each stage",
        Parameter::None,
        &[Change::Report(|_, found, _| {
            let since = last_end(found).map_or(0.0, |state| state.time);
            shift_time(found, -since);
        })],
    ),
    of(
        "depth-restarts",
        "the depth reported is counted from the start of the stage",
        Parameter::None,
        &[Change::Report(|p, found, _| found.end.depth -= p.start_of(found.stage))],
    ),
    of(
        "offset",
        "the depth reported is {} m too deep",
        Parameter::Offset,
        &[Change::Report(|_, found, by| found.end.depth += by)],
    ),
    of(
        "offset",
        "the time reported is {} s too late",
        Parameter::Offset,
        &[Change::Report(|_, found, by| shift_time(found, by))],
    ),
    of(
        "unit:depth",
        "the depth reported is {} times the right one",
        Parameter::Unit,
        &[Change::Report(|_, found, f| found.end.depth *= f)],
    ),
    of(
        "unit:time",
        "the time reported is {} times the right one",
        Parameter::Unit,
        &[Change::Report(|_, found, f| found.end.time *= f)],
    ),
    of(
        "unit:velocity",
        "the velocity reported is {} times the right one",
        Parameter::Unit,
        &[Change::Report(|_, found, f| found.end.velocity *= f)],
    ),
    of(
        "time-restarts",
        "the times of the ends of all stages are added up",
        Parameter::None,
        &[Change::Report(|_, found, _| {
            let before: f64 =
                found.passed.iter().filter(|(index, _)| *index < found.stage).map(|(_, state)| state.time).sum();
            shift_time(found, before);
        })],
    ),
    of(
        "velocity-stale",
        "only the velocity is wrong, as that of a step before the end",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| {
            found.end.velocity = continued(p, found.stage, found.end, -late).map_or(f64::NAN, |state| state.velocity);
        })],
    ),
    of(
        "velocity-misreported",
        "the velocity reported is depth over time",
        Parameter::None,
        &[Change::Report(|_, found, _| {
            if found.end.velocity > 0.0 {
                found.end.velocity = found.end.depth / found.end.time;
            }
        })],
    ),
    of(
        "velocity-misreported",
        "the velocity reported is the impact speed",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            if found.end.velocity > 0.0 {
                found.end.velocity = p.impact_speed;
            }
        })],
    ),
    of(
        "velocity-misreported",
        "the velocity reported is never above the impact speed",
        Parameter::None,
        &[Change::Report(|p, found, _| found.end.velocity = found.end.velocity.min(p.impact_speed))],
    ),
    of(
        "velocity-misreported",
        "the velocity reported is what was lost: V0 - V",
        Parameter::None,
        &[Change::Report(|p, found, _| found.end.velocity = p.impact_speed - found.end.velocity)],
    ),
    of(
        "velocity-misreported",
        "the velocity reported is its square",
        Parameter::None,
        &[Change::Report(|_, found, _| found.end.velocity *= found.end.velocity)],
    ),
    of(
        "velocity-misreported",
        "the velocity reported is zero",
        Parameter::None,
        &[Change::Report(|_, found, _| found.end.velocity = 0.0)],
    ),
    of(
        "velocity-misreported",
        "the velocity at the exit is that of {} times the energy lost",
        Parameter::Factor,
        &[Change::Report(|p, found, f| {
            of_exit(p, found, |speed, impact| {
                (impact * impact - f * (impact * impact - speed * speed)).max(0.0).sqrt()
            });
        })],
    ),
    of(
        "velocity-misreported",
        "the velocity at the exit is that of {} times the velocity lost",
        Parameter::Factor,
        &[Change::Report(|p, found, f| of_exit(p, found, |speed, impact| impact - f * (impact - speed)))],
    ),
    of(
        "time-formula",
        "the time in the first stage is {} times the right one",
        Parameter::Factor,
        &[Change::Report(|_, found, f| {
            let first = first_end(found).unwrap_or(found.end).time;
            found.end.time += (f - 1.0) * first;
        })],
    ),
    of(
        "time-formula",
        "the time in the last stage is {} times the right one",
        Parameter::Factor,
        &[Change::Report(|_, found, f| {
            let last = found.end.time - last_end(found).map_or(0.0, |state| state.time);
            found.end.time += (f - 1.0) * last;
        })],
    ),
    of(
        "time-formula",
        "the time of a stage is its length over the mean of V at its two ends",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            found.end.time = legs(p, found).map(|[a, b]| 2.0 * (b.depth - a.depth) / (a.velocity + b.velocity)).sum();
        })],
    ),
    of(
        "time-formula",
        "the time of a stage is its length over V at its start",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            found.end.time = legs(p, found).map(|[a, b]| (b.depth - a.depth) / a.velocity).sum();
        })],
    ),
    of(
        "time-formula",
        "the time of a stage is its length over V at its end",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            found.end.time = legs(p, found).map(|[a, b]| (b.depth - a.depth) / b.velocity).sum();
        })],
    ),
    of(
        "time-left-out",
        "the time in the first stage is not counted",
        Parameter::None,
        &[Change::Report(|_, found, _| {
            found.end.time -= first_end(found).unwrap_or(found.end).time;
        })],
    ),
    of(
        "time-left-out",
        "the clock starts at the end of the first stage",
        Parameter::None,
        &[Change::Report(|_, found, _| {
            found.end.time -= first_end(found).map_or(0.0, |state| state.time);
        })],
    ),
    of(
        "time-left-out",
        "the time in the last stage is not counted",
        Parameter::None,
        &[Change::Report(|_, found, _| found.end.time = last_end(found).map_or(0.0, |state| state.time))],
    ),
    of(
        "time-left-out",
        "the time in stages without force is not counted",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            let free: f64 = legs(p, found)
                .enumerate()
                .filter(|(index, _)| p.stages.get(*index).is_some_and(|law| law.force(1.0, 1.0) == 0.0))
                .map(|(_, [from, to])| to.time - from.time)
                .sum();
            found.end.time -= free;
        })],
    ),
    of(
        "exit-velocity-stale",
        "the velocity reported at the exit is that at the start of the stage",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            if found.end.depth >= p.exit_depth {
                found.end.velocity = last_end(found).map_or(p.impact_speed, |state| state.velocity);
            }
        })],
    ),
    of(
        "exit-velocity-stale",
        "the velocity reported at the exit is the mean of that at the start of the stage and at the exit",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            if found.end.depth >= p.exit_depth {
                found.end.velocity =
                    0.5 * (found.end.velocity + last_end(found).map_or(p.impact_speed, |state| state.velocity));
            }
        })],
    ),
];
