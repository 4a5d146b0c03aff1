//! Faults of events: ends of stages, exit and rest that are late, early, misplaced, missed, or change the state.

use super::super::questions::Question;
use super::super::simulation::{Simulated, continued};
use super::force::reorder;
use super::{Change, Hypothesis, Parameter, of};
use crate::physics::{Problem, State};

/// The ends that a flight may miss: from stage `j`, whose law goes on, up to stage `m`, as `8 j + m`.
fn ends_missed(question: &Question) -> Vec<f64> {
    let count = question.problem.stages.len();
    let pairs = (0..count).flat_map(|from| (from + 1..count).map(move |to| (8 * from + to) as f64));
    std::iter::once(0.0).chain(pairs).collect()
}

fn miss_ends(problem: &mut Problem, number: f64) {
    let (from, to) = (number as usize / 8, number as usize % 8);
    if to > from
        && let Some(end) = problem.stages.get(to).map(|stage| stage.end)
    {
        problem.stages[from].end = end;
        problem.stages.drain(from + 1..=to);
    }
}

/// Ends of stages and exit moved by `delay` (m), where the flight passes exactly one end.
fn delay_end(problem: &mut Problem, delay: f64) {
    let exit = problem.exit_depth;
    let inside: Vec<usize> = (0..problem.stages.len()).filter(|index| problem.stages[*index].end < exit).collect();
    if let [only] = inside[..] {
        problem.stages[only].end += delay;
    }
}

fn exit_at_start_of_last(problem: &mut Problem) {
    let start = problem.start_of(problem.stages.len() - 1);
    problem.exit_depth = problem.exit_depth.max(start);
}

fn clear_speed(_: &Problem, found: &mut Simulated, speed: f64) {
    if found.end.velocity <= speed {
        found.end.velocity = 0.0;
    }
}

fn rest_late(problem: &Problem, found: &mut Simulated, late: f64) {
    if found.end.velocity > 0.0 {
        return;
    }
    let none = State { time: f64::NAN, ..found.end };
    found.end = continued(problem, found.stage, found.end, late).unwrap_or(none);
}

/// Faults of events.
pub(super) static FAULTS: &[Hypothesis] = &[
    of(
        "stage-end-missed",
        "no end of a stage is seen: the law of the first one holds throughout",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |_, _| 0))],
    ),
    of(
        "stage-end-missed",
        "the end of the first stage alone is seen: the law of the second one holds from there on",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |index, _| index.min(1)))],
    ),
    of(
        "stage-end-missed",
        "ends of stages are missed now and then, and the law before them goes on",
        Parameter::Choice(ends_missed),
        &[Change::Problem(miss_ends)],
    ),
    of(
        "stage-end-misplaced",
        "stages end at {} times their ends",
        Parameter::Factor,
        &[Change::Problem(|p, f| p.stages.iter_mut().for_each(|law| law.end *= f))],
    ),
    of(
        "stage-end-misplaced",
        "the ends of stages are taken for their lengths",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let mut sum = 0.0;
            for law in &mut p.stages {
                sum += law.end;
                law.end = sum;
            }
        })],
    ),
    of(
        "exit-misplaced",
        "the exit lies at {} times its depth",
        Parameter::Factor,
        &[Change::Problem(|p, f| p.exit_depth *= f)],
    ),
    of(
        "exit-misplaced",
        "the exit lies {} m too near",
        Parameter::Value,
        &[Change::Problem(|p, by| p.exit_depth -= by)],
    ),
    of(
        "exit-misplaced",
        "the exit lies {} m too deep",
        Parameter::Value,
        &[Change::Problem(|p, by| p.exit_depth += by)],
    ),
    of(
        "exit-misplaced",
        "the exit is counted from the start of the last stage",
        Parameter::None,
        &[Change::Problem(|p, _| p.exit_depth += p.start_of(p.stages.len() - 1))],
    ),
    of(
        "exit-misplaced",
        "the exit is that of the last end of a stage",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let start = p.start_of(p.stages.len() - 1);
            if p.has_exit() && start > 0.0 {
                p.exit_depth = start;
            }
        })],
    ),
    of(
        "exit-ignored",
        "the exit is ignored: the flight goes on to rest",
        Parameter::None,
        &[Change::Problem(|p, _| p.exit_depth = f64::INFINITY)],
    ),
    of(
        "exit-missed",
        "an exit at the very end of a stage is missed",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.stages.iter().any(|law| law.end == p.exit_depth) {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-missed",
        "exit and ends of stages are missed where the projectile comes to rest just beyond them, within one step",
        Parameter::Choice(ends_missed),
        &[Change::Problem(|p, number| {
            p.exit_depth = f64::INFINITY;
            miss_ends(p, number);
        })],
    ),
    of(
        "exit-missed",
        "the exit is missed where the projectile comes to rest just beyond it, within one step",
        Parameter::Choice(|_| vec![1.0]),
        &[Change::Problem(|p, _| p.exit_depth = f64::INFINITY)],
    ),
    of(
        "exit-last-stage-only",
        "the exit is looked for in the last stage alone, and seen as soon as that is entered",
        Parameter::None,
        &[Change::Problem(|p, _| exit_at_start_of_last(p))],
    ),
    of(
        "exit-last-stage-only",
        "the exit is looked for in the last stage alone, and not seen before it",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.exit_depth <= p.start_of(p.stages.len() - 1) {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-first-stage-missed",
        "the exit is not looked for in the first stage, and seen as soon as that is left",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.stages[0].end.is_finite() {
                p.exit_depth = p.exit_depth.max(p.stages[0].end);
            }
        })],
    ),
    of(
        "exit-first-stage-missed",
        "the exit is not looked for in the first stage",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.exit_depth <= p.stages[0].end {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "exit-first-stage-only",
        "the exit is looked for in the first stage alone",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.exit_depth > p.stages[0].end {
                p.exit_depth = f64::INFINITY;
            }
        })],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} m/s, and that speed is reported",
        Parameter::Speed,
        &[Change::RestSpeed(|_, speed| speed)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} m/s",
        Parameter::Speed,
        &[Change::RestSpeed(|_, speed| speed), Change::Report(clear_speed)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} V0, and that speed is reported",
        Parameter::Fraction,
        &[Change::RestSpeed(|p, part| part * p.impact_speed)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below {} V0",
        Parameter::Fraction,
        &[
            Change::RestSpeed(|p, part| part * p.impact_speed),
            Change::Report(|p, found, part| clear_speed(p, found, part * p.impact_speed)),
        ],
    ),
    of(
        "exit-late",
        "the exit is taken at the end of the step that passes it",
        Parameter::Delay,
        &[Change::Problem(|p, delay| p.exit_depth += delay)],
    ),
    of(
        "exit-late",
        "time and velocity at the exit are those of the end of the step that passes it",
        Parameter::Delay,
        &[
            Change::Problem(|p, delay| p.exit_depth += delay),
            Change::Report(|p, found, delay| {
                if found.end.depth >= p.exit_depth {
                    found.end.depth -= delay;
                }
            }),
        ],
    ),
    of(
        "rest-late",
        "rest is taken at the end of the step in which V changes its sign",
        Parameter::Lateness,
        &[Change::Report(rest_late)],
    ),
    of(
        "rest-late",
        "rest is taken at the end of the step in which V changes its sign, with V = 0",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| {
            rest_late(p, found, late);
            found.end.velocity = found.end.velocity.max(0.0);
        })],
    ),
    of(
        "rest-early",
        "the flight ends at the last step before rest",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| rest_late(p, found, -late))],
    ),
    of(
        "rest-early",
        "the flight ends at the last step before rest, with V = 0",
        Parameter::Lateness,
        &[Change::Report(|p, found, late| {
            let is_rest = found.end.velocity <= 0.0;
            rest_late(p, found, -late);
            if is_rest {
                found.end.velocity = 0.0;
            }
        })],
    ),
    of(
        "stage-end-late",
        "the end of a stage is taken at the end of the step that passes it",
        Parameter::Delay,
        &[Change::Problem(delay_end)],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below a kinetic energy of {} J, and its speed is reported",
        Parameter::Value,
        &[Change::RestSpeed(|p, energy| (2.0 * energy / p.mass).sqrt())],
    ),
    of(
        "rest-threshold",
        "the projectile counts as at rest below a kinetic energy of {} J",
        Parameter::Value,
        &[
            Change::RestSpeed(|p, energy| (2.0 * energy / p.mass).sqrt()),
            Change::Report(|p, found, energy| clear_speed(p, found, (2.0 * energy / p.mass).sqrt())),
        ],
    ),
    of(
        "flight-cut-short",
        "the flight ends after {} s, wherever it is",
        Parameter::Value,
        &[Change::EndTime(|_, time| time)],
    ),
    of(
        "flight-cut-short",
        "the flight ends on its way: at a number of steps, or where a step fails",
        Parameter::Lateness,
        &[Change::EndTime(|end, early| (end - early).max(0.0))],
    ),
    of(
        "stage-end-velocity",
        "V is {} times the right one behind each end of a stage",
        Parameter::Factor,
        &[Change::AtStageEnd(|_, state, f| state.velocity *= f)],
    ),
    of(
        "stage-end-velocity",
        "V is the impact speed again behind each end of a stage",
        Parameter::None,
        &[Change::AtStageEnd(|p, state, _| state.velocity = p.impact_speed)],
    ),
    of(
        "time-restarts",
        "the time doubles at each end of a stage: the time of its end is added to that of its start",
        Parameter::None,
        &[Change::AtStageEnd(|_, state, _| state.time *= 2.0)],
    ),
];
