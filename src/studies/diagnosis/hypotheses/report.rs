//! Faults of the report: the flight is right, and a number of its end is not.

use super::super::questions::Question;
use super::super::simulation::{Simulated, continued};
use super::{Change, DIGITS, GRAINS, Hypothesis, Parameter, of, to_digits, to_grain, to_single};
use crate::physics::{Problem, Stage, State};

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

/// The flight through a stage.
struct Leg<'a> {
    index: usize,
    is_last: bool,
    law: &'a Stage,
    from: State,
    to: State,
}

impl Leg<'_> {
    fn time(&self) -> f64 {
        self.to.time - self.from.time
    }

    /// Its time at one speed.
    fn time_at(&self, speed: f64) -> f64 {
        (self.to.depth - self.from.depth) / speed
    }

    fn mean_speed(&self) -> f64 {
        0.5 * (self.from.velocity + self.to.velocity)
    }

    fn is_free(&self) -> bool {
        self.law.force(1.0, 1.0) == 0.0
    }

    fn is_of_rest(&self) -> bool {
        self.to.velocity <= 0.0
    }

    /// Whether it has stiffness, viscosity, drag.
    fn terms(&self) -> [bool; 3] {
        [self.law.stiffness, self.law.viscosity, self.law.drag].map(|term| term != 0.0)
    }

    /// Whether it has a closed form: one term at most beside the static force.
    fn is_simple(&self) -> bool {
        self.terms().iter().filter(|is| **is).count() < 2
    }

    /// Its time by `of` a and b, `V sqrt(q/p)` at both ends, over `sqrt(p q)/M`: right with `atan(a) - atan(b)`. That of
    /// another law stays.
    fn of_arctangents(&self, mass: f64, of: impl Fn(f64, f64) -> f64) -> f64 {
        let Stage { static_force, drag, .. } = *self.law;
        if self.terms() != [false, false, true] || static_force <= 0.0 {
            return self.time();
        }
        let at = |state: State| state.velocity * (drag / static_force).sqrt();
        mass / (static_force * drag).sqrt() * of(at(self.from), at(self.to))
    }

    /// The time in which it would slow down to the velocity at its end from `speed`: of a static force that resists, alone or
    /// beside drag. That of another law stays.
    fn time_from(&self, mass: f64, speed: f64) -> f64 {
        let Stage { static_force, drag, .. } = *self.law;
        match self.terms() {
            [false, false, false] if static_force > 0.0 => mass * (speed - self.to.velocity) / static_force,
            _ => self.of_arctangents(mass, |_, b| (speed * (drag / static_force).sqrt()).atan() - b.atan()),
        }
    }

    /// What its time lacks if a quarter of an oscillation takes `factor` times its time: of rest under a spring and a static force.
    fn of_quarter(&self, mass: f64, factor: f64) -> f64 {
        let stiffness = self.law.stiffness;
        let is_oscillation = self.is_of_rest() && stiffness > 0.0 && self.terms() == [true, false, false];
        if is_oscillation { (factor - 1.0) * std::f64::consts::FRAC_PI_2 * (mass / stiffness).sqrt() } else { 0.0 }
    }
}

fn legs<'a>(problem: &'a Problem, found: &Simulated) -> impl Iterator<Item = Leg<'a>> {
    let ends = found.passed.iter().filter(|(index, _)| *index < found.stage).map(|(_, state)| *state);
    let all: Vec<State> = std::iter::once(State::at_impact(problem)).chain(ends).chain([found.end]).collect();
    let count = all.len() - 1;
    problem.stages.iter().enumerate().take(count).map(move |(index, law)| Leg {
        index,
        is_last: index + 1 == count,
        law,
        from: all[index],
        to: all[index + 1],
    })
}

/// The time of each stage by a rule.
fn retime(problem: &Problem, found: &mut Simulated, time: impl Fn(&Leg<'_>) -> f64) {
    found.end.time = legs(problem, found).map(|leg| time(&leg)).sum();
}

/// How far it is through a stage, to its end or to the exit.
fn thickness(problem: &Problem, index: usize) -> f64 {
    problem.limit_of(index) - problem.start_of(index)
}

fn thicknesses(question: &Question) -> Vec<f64> {
    (0..question.problem.stages.len()).map(|index| thickness(&question.problem, index)).collect()
}

/// The time in some stages by other rules: of any kind of stage, or of one whose velocity does not change evenly.
macro_rules! timed {
    (of any $stages:literal, $is:expr) => {
        [
            timed!("time-formula", $stages, " is {} times the right one", Factor, $is, |leg, _, n| n * leg.time()),
            timed!("time-left-out", $stages, " is not counted", None, $is, |_, _, _| 0.0),
            timed!("time-formula", $stages, " is that of V0 throughout", None, $is, |leg, p, _| leg
                .time_at(p.impact_speed)),
        ]
    };
    (of uneven $stages:literal, $is:expr) => {
        [
            timed!("time-formula", $stages, " is that of V at the start throughout", None, $is, |leg, _, _| leg
                .time_at(leg.from.velocity)),
            timed!("time-formula", $stages, " is that of the mean of V at both ends", None, $is, |leg, _, _| leg
                .time_at(leg.mean_speed())),
        ]
    };
    ($id:literal, $stages:literal, $says:literal, $number:ident, $is:expr, |$leg:pat_param, $p:pat_param, $n:pat_param| $time:expr) => {
        of(
            $id,
            concat!("the time in ", $stages, $says),
            Parameter::$number,
            &[Change::Report(|p, found, n| {
                let is_one: fn(&Leg<'_>) -> bool = $is;
                let time: fn(&Leg<'_>, &Problem, f64) -> f64 = |$leg, $p, $n| $time;
                retime(p, found, |leg| if is_one(leg) { time(leg, p, n) } else { leg.time() });
            })],
        )
    };
}

/// Times by other rules than the flight.
pub(super) static TIMES: [[Hypothesis; 3]; 10] = [
    timed!(of any "the first stage", |leg| leg.index == 0),
    timed!(of any "the last stage", |leg| leg.is_last),
    timed!(of any "the stage of rest", |leg| leg.is_of_rest()),
    timed!(of any "stages without force", |leg| leg.is_free()),
    timed!(of any "stages of a static force alone", |leg| leg.terms() == [false; 3] && !leg.is_free()),
    timed!(of any "stages of stiffness, or that and a static force", |leg| leg.terms() == [true, false, false]),
    timed!(of any "stages of viscosity, or that and a static force", |leg| leg.terms() == [false, true, false]),
    timed!(of any "stages of drag, or that and a static force", |leg| leg.terms() == [false, false, true]),
    timed!(of any "stages of a static force and one other term, or less", |leg| leg.is_simple()),
    timed!(of any "stages that drive", |leg| leg.law.static_force < 0.0),
];

/// The same by formulas that are right where V changes evenly.
pub(super) static UNEVEN_TIMES: [[Hypothesis; 2]; 9] = [
    timed!(of uneven "every stage", |_| true),
    timed!(of uneven "the first stage", |leg| leg.index == 0),
    timed!(of uneven "the last stage", |leg| leg.is_last),
    timed!(of uneven "the stage of rest", |leg| leg.is_of_rest()),
    timed!(of uneven "stages of stiffness, or that and a static force", |leg| leg.terms() == [true, false, false]),
    timed!(of uneven "stages of viscosity, or that and a static force", |leg| leg.terms() == [false, true, false]),
    timed!(of uneven "stages of drag, or that and a static force", |leg| leg.terms() == [false, false, true]),
    timed!(of uneven "stages of a static force and one other term, or less", |leg| leg.is_simple()),
    timed!(of uneven "stages that drive", |leg| leg.law.static_force < 0.0),
];

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
        "only the time is wrong, and late, as that of the end of a step, or of a clock that goes on by more than its steps",
        Parameter::Lateness,
        &[Change::Report(|_, found, late| shift_time(found, late))],
    ),
    of(
        "event-time-early",
        "only the time is wrong, and early, as that of the start of a step, or of a clock that leaves out part of the steps",
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
        "the time is {} times the right one, and the path is right",
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
        "time-restarts",
        "the time at which the last stage starts is added to that of the end",
        Parameter::None,
        &[Change::Report(|_, found, _| {
            let start = last_end(found).map_or(0.0, |state| state.time);
            shift_time(found, start);
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
        "velocity-misreported",
        "the velocity at the exit is the root of V0² - V_c², which is right without drag alone",
        Parameter::None,
        &[Change::Report(|p, found, _| {
            // With static force, stiffness and drag V² = (V0² - V_c²) exp(-2 (q1 l1 + q2 l2 + ...)/M); where the force of a crater
            // goes on into the tunnel, c depends on V there, and (V0² - V_c²) is 1 + k d Q/M times that behind the crater.
            let lost: f64 = legs(p, found).map(|leg| leg.law.drag * (leg.to.depth - leg.from.depth)).sum();
            let goes_on = |state: &State| {
                let [crater, tunnel] = [0, 1].map(|stage| p.stages[stage].force(state.depth, state.velocity));
                p.crater == Some(0) && (crater - tunnel).abs() <= 1e-9 * crater
            };
            let behind = first_end(found).filter(goes_on);
            let of_crater = behind.map_or(1.0, |state| 1.0 + state.depth * p.stages[1].drag / p.mass);
            let factor = of_crater.sqrt() * (lost / p.mass).exp();
            of_exit(p, found, |speed, _| speed * factor);
        })],
    ),
    timed!("time-formula", "every stage", " is that of V0 throughout", None, |_| true, |leg, p, _| leg
        .time_at(p.impact_speed)),
    timed!("time-formula", "every stage", " is that of V at the end throughout", None, |_| true, |leg, _, _| leg
        .time_at(leg.to.velocity)),
    of(
        "time-formula",
        "a quarter of an oscillation, at whose end a spring stops the projectile, takes {} times its time",
        Parameter::Factor,
        &[Change::Report(|p, found, n| retime(p, found, |leg| leg.time() + leg.of_quarter(p.mass, n)))],
    ),
    of(
        "time-formula",
        "the time in stages of a static force and drag has atan(a - b) in place of atan(a) - atan(b), with a and b of V at both ends",
        Parameter::None,
        &[Change::Report(|p, found, _| retime(p, found, |leg| leg.of_arctangents(p.mass, |a, b| (a - b).atan())))],
    ),
    of(
        "time-formula",
        "the time in stages of a static force and drag is that to rest, wherever they end",
        Parameter::None,
        &[Change::Report(|p, found, _| retime(p, found, |leg| leg.of_arctangents(p.mass, |a, _| a.atan())))],
    ),
    of(
        "time-formula",
        "the time in stages of a static force, or that and drag, is that of slowing down from V0, not from V at the start",
        Parameter::None,
        &[Change::Report(|p, found, _| retime(p, found, |leg| leg.time_from(p.mass, p.impact_speed)))],
    ),
    of(
        "stage-left-out",
        "stages that end, or are left, less than {} m behind their start are passed in no time, with V as it is",
        Parameter::Threshold(0.01, thicknesses),
        &[
            Change::Problem(|p, least| {
                for index in 0..p.stages.len() {
                    if thickness(p, index) < least {
                        p.stages[index] = Stage::free().until(p.stages[index].end);
                    }
                }
            }),
            Change::Report(|p, found, least| {
                retime(p, found, |leg| if thickness(p, leg.index) < least { 0.0 } else { leg.time() });
            }),
        ],
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
