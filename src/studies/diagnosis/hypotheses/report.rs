//! Faults of the report: the flight is right, and a number of its end is not.

use super::super::simulation::{Simulated, continued};
use super::{Change, Hypothesis, Parameter, of};
use crate::physics::State;

fn shift_time(found: &mut Simulated, by: f64) {
    found.end.time += by;
}

/// The last end of a stage before the stage of the end.
pub(super) fn last_end(found: &Simulated) -> Option<State> {
    found.passed.iter().rev().find(|(index, _)| *index < found.stage).map(|(_, state)| *state)
}

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
        "the time of the end is that of the end of a step, and late",
        Parameter::Lateness,
        &[Change::Report(|_, found, late| shift_time(found, late))],
    ),
    of(
        "event-time-early",
        "the time of the end is that of the start of a step, and early",
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
        "the velocity reported is that of a step before the end",
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
];
