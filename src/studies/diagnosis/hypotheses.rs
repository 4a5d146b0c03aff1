//! What can be wrong with a solver: one small change of the problem, of the force or of the answer each.
//!
//! A hypothesis says what a solver with its fault would answer; [`super::causes`] asks which of them explains the answers
//! that came. The next one is one more entry of the table of its kind: `force`, `formulas`, `spread`, `events`,
//! `report` or `scene`.

/// A number of the problem or of its end that is rounded: what it is called, its unit, what `Change` reaches it, and where.
macro_rules! rounded {
    ($id:literal, $what:literal, $unit:literal, $change:ident($($bound:tt),*; $n:ident) $place:expr) => {
        [
            of(
                $id,
                concat!($what, " is rounded to a multiple of {} ", $unit),
                Parameter::OneOf(GRAINS),
                &[Change::$change(|$($bound),*, $n| $place = to_grain($place, $n))],
            ),
            of(
                $id,
                concat!($what, " is cut to a multiple of {} ", $unit),
                Parameter::OneOf(GRAINS),
                &[Change::$change(|$($bound),*, $n| $place = ($place / $n).floor() * $n)],
            ),
            of(
                $id,
                concat!($what, " is rounded to {} digits"),
                Parameter::OneOf(DIGITS),
                &[Change::$change(|$($bound),*, $n| $place = to_digits($place, $n))],
            ),
            of(
                $id,
                concat!($what, " is rounded to single precision"),
                Parameter::None,
                &[Change::$change(|$($bound),*, _| $place = to_single($place))],
            ),
        ]
    };
}

/// The same of one that has a bound, here one as it may be.
macro_rules! bounded {
    ($id:literal, $what:literal, $unit:literal, $usual:literal, $change:ident($($bound:tt),*; $n:ident) $place:expr) => {
        [
            of(
                $id,
                concat!($what, " is at most {} ", $unit),
                Parameter::Value($usual),
                &[Change::$change(|$($bound),*, $n| $place = $place.min($n))],
            ),
            of(
                $id,
                concat!($what, " is at least {} ", $unit),
                Parameter::Value($usual),
                &[Change::$change(|$($bound),*, $n| $place = $place.max($n))],
            ),
        ]
    };
}

mod events;
mod force;
mod formulas;
mod neighbours;
mod report;
mod scene;
mod spread;
mod written;

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

#[cfg(feature = "report")]
use rayon::prelude::*;
#[cfg(feature = "report")]
use serde::Serialize;

use self::written::Written;
pub(super) use self::written::slips_of_scenes;
#[cfg(feature = "report")]
use super::Each;
#[cfg(feature = "report")]
use super::questions::{Content, questions};
use super::questions::{Earlier, Question};
use super::simulation::{AtStageEnd, Force, Rules, Simulated, simulate, solve};
use crate::exchange::peers::wire::conditioning;
#[cfg(feature = "report")]
use crate::exchange::peers::wire::errors;
use crate::physics::{Concrete, Problem, Scene, State};
use crate::studies::scheme_of_table::Scheme;

/// A fault, and what it does.
#[derive(Debug)]
pub(super) struct Hypothesis {
    /// Id of the cause (`docs/reference.md`, "Diagnosis").
    pub id: &'static str,
    /// What is wrong, as a sentence; `{}` stands for the number.
    pub statement: &'static str,
    /// The number in it.
    pub parameter: Parameter,
    /// What it changes, each with that number.
    pub changes: &'static [Change],
}

/// The number in a hypothesis.
#[derive(Clone, Copy, Debug)]
pub(super) enum Parameter {
    /// None.
    None,
    /// A factor over the right one, the same in every answer; 0 leaves out, negative is a wrong sign.
    Factor,
    /// A factor as of units: many powers of ten, of either sign.
    Unit,
    /// What is added, of either sign, the same in every answer.
    Offset,
    /// An exponent, the same in every answer; here the right one.
    Exponent(#[cfg_attr(not(feature = "report"), expect(dead_code, reason = "a claim asks for it"))] f64),
    /// A speed (m/s), the same in every answer.
    Speed,
    /// Part of the impact speed, or of a length, the same in every answer.
    Fraction,
    /// A distance (m), another one in every answer.
    Delay,
    /// A time (s), another one in every answer.
    Lateness,
    /// One of a few numbers, the same in every answer.
    OneOf(&'static [f64]),
    /// A value in place of that of the question, the same in every answer; here one as it may be.
    Value(
        #[cfg_attr(
            not(any(test, feature = "report")),
            expect(dead_code, reason = "solvers that are wrong on purpose have it")
        )]
        f64,
    ),
    /// A value as well, which matters only in passing one of the numbers that the question has.
    Threshold(
        #[cfg_attr(
            not(any(test, feature = "report")),
            expect(dead_code, reason = "solvers that are wrong on purpose have it")
        )]
        f64,
        fn(&Question) -> Vec<f64>,
    ),
    /// A time (s), another one in every answer, which flights of one event alone show.
    Bracket,
    /// A distance (m), another one in every answer, which flights through one end of a stage show.
    Overshoot,
    /// A factor near one, another one in every answer.
    Nearness,
    /// One of a few numbers, another one in every answer.
    Choice(fn(&Question) -> Vec<f64>),
}

/// What a fault changes, by one number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Change {
    /// The scene, for a solver that reads it.
    Scene(fn(&mut Scene, f64)),
    /// What is formed of the scene.
    Written(&'static Written),
    /// The problem.
    Problem(fn(&mut Problem, f64)),
    /// The force.
    Force(Force),
    /// The speed (m/s) that counts as rest.
    RestSpeed(fn(&Problem, f64) -> f64),
    /// The same as a part of V at the start of the stage: the number.
    RestPart,
    /// The problem, by the end of the right flight.
    OfRight(fn(&mut Problem, &State, f64)),
    /// The problem, by the scene.
    OfScene(fn(&Concrete, &mut Problem, f64)),
    /// The problem, by what was asked earlier.
    Kept(fn(&mut Problem, &Earlier)),
    /// The time (s) at which the flight ends wherever it is, from that of the right end.
    EndTime(fn(&Problem, f64, f64) -> f64),
    /// The same (s), since the start of a stage.
    StageTime(fn(&Problem, f64) -> f64),
    /// The state behind each end of a stage.
    AtStageEnd(AtStageEnd),
    /// What is reported of a flight through the problem.
    Report(fn(&Problem, &mut Simulated, f64)),
}

impl Parameter {
    /// Whether each answer has a number of its own.
    pub(super) fn is_per_answer(self) -> bool {
        matches!(
            self,
            Self::Delay | Self::Lateness | Self::Bracket | Self::Overshoot | Self::Nearness | Self::Choice(_)
        )
    }

    /// A number of its own over the depth or the time of the flight; `None` for one of all answers.
    pub(super) fn share(self, number: f64, question: &Question) -> Option<f64> {
        match self {
            Self::Delay | Self::Overshoot => Some(number / question.exact.end.depth),
            Self::Lateness => Some(number / question.exact.end.time),
            _ => None,
        }
    }

    /// Freedom that an explanation has, for the choice of the simplest.
    pub(super) fn freedom(self) -> u8 {
        match self {
            Self::None => 0,
            _ if !self.is_per_answer() => 1,
            Self::Choice(_) => 2,
            _ => 3,
        }
    }

    /// Numbers at one of which nothing is wrong: none for one that has no such number; a factor of something that is added
    /// has none of it at zero.
    #[cfg(feature = "report")]
    pub(super) fn neutral(self) -> Vec<f64> {
        match self {
            Self::Factor | Self::Unit => vec![1.0, 0.0],
            Self::Offset => vec![0.0],
            Self::Nearness => vec![1.0],
            Self::Exponent(right) => vec![right],
            _ => Vec::new(),
        }
    }

    /// A number as it may be.
    #[cfg(any(test, feature = "report"))]
    pub(super) fn example(self) -> f64 {
        match self {
            Self::Factor => 1.25,
            Self::Unit => 1e3,
            Self::Exponent(_) => 1.7,
            Self::Speed => 0.5,
            Self::Fraction | Self::Offset => 0.01,
            // Few digits or stages, or a grain that is seen.
            Self::OneOf(numbers) if numbers[0] < 1.0 => numbers[numbers.len() / 2],
            Self::OneOf(numbers) => numbers[1],
            Self::Value(usual) | Self::Threshold(usual, _) => usual,
            _ => 1.0,
        }
    }

    /// A number as the answer to `question` may have it, where each answer has its own; `None` for one of all answers.
    #[cfg(any(test, feature = "report"))]
    pub(super) fn own_example(self, question: &Question) -> Option<f64> {
        let end = question.exact.end;
        // Where in its step an event falls differs from question to question.
        let part = 0.01 * (0.1 + (1e3 * end.time / end.depth).sin().abs());
        match self {
            Self::Delay | Self::Overshoot => Some(part * end.depth),
            Self::Lateness | Self::Bracket => Some(part * end.time),
            Self::Nearness => Some(1.0 + part),
            Self::Choice(of) => of(question).into_iter().find(|number| *number != 1.0),
            _ => None,
        }
    }

    /// Whether the number is the factor of a cause.
    pub(super) fn is_factor(self) -> bool {
        matches!(self, Self::Factor | Self::Unit | Self::Speed)
    }

    /// Numbers between which one is looked for, ascending.
    pub(super) fn grid(self, question: &Question) -> Vec<f64> {
        let spread = |from: f64, to: f64, count: i32| {
            (0..=count).map(move |i| from * (to / from).powf(f64::from(i) / f64::from(count)))
        };
        let both = |positive: Vec<f64>| {
            let negative: Vec<f64> = positive.iter().rev().map(|value| -value).collect();
            [negative, vec![0.0], positive].concat()
        };
        match self {
            Self::None => vec![1.0],
            Self::Factor => both(spread(0.01, 30.0, 36).collect()),
            Self::Unit => both(spread(1e-7, 1e7, 42).collect()),
            Self::Offset => both(spread(1e-9, 1e6, 45).collect()),
            Self::OneOf(numbers) => numbers.to_vec(),
            Self::Value(_) => spread(1e-6, 1e9, 120).collect(),
            Self::Threshold(_, of) => between(of(question)),
            Self::Exponent(_) => (0..=24).map(|i| 0.25 * f64::from(i)).collect(),
            Self::Speed => spread(1e-9, 1e3, 72).collect(),
            Self::Fraction => spread(1e-12, 0.9, 60).collect(),
            Self::Delay | Self::Overshoot => {
                spread(1e-10, 10.0, 44).map(|part| part * question.exact.end.depth).collect()
            }
            Self::Lateness | Self::Bracket => {
                spread(1e-10, 1.0, 40).map(|part| part * question.exact.end.time).collect()
            }
            Self::Nearness => {
                let off: Vec<f64> = spread(1e-8, 0.05, 28).collect();
                off.iter().rev().map(|off| 1.0 - off).chain(off.iter().map(|off| 1.0 + off)).collect()
            }
            Self::Choice(of) => of(question),
        }
    }
}

/// How a flight is solved: exactly, or by a scheme of fixed steps.
#[derive(Clone, Copy, Debug)]
pub(super) enum How {
    /// To round-off.
    Exact,
    /// By a scheme with steps of so many seconds.
    Scheme(Scheme, f64),
}

/// A fault with its number.
pub(super) type Fault<'a> = (&'a Hypothesis, f64);

/// What a solver with `faults` answers to `question`, and the problem that it solved.
///
/// `None` where a fault cannot be simulated, or leaves the flight without an end.
pub(super) fn predict(question: &Question, faults: &[Fault<'_>], how: How) -> Option<(Problem, Simulated)> {
    let changes =
        || faults.iter().flat_map(|(fault, number)| fault.changes.iter().map(move |change| (change, *number)));
    let mut problem = question.problem.clone();
    let mut written = None;
    if changes().any(|(change, _)| matches!(change, Change::Scene(_) | Change::Written(_))) {
        let mut scene = question.scene.clone()?;
        for (change, number) in changes() {
            match change {
                Change::Scene(alter) => alter(&mut scene, number),
                // Two formulas cannot both be the one.
                Change::Written(_) if written.is_some() => return None,
                Change::Written(other) => written = Some(other),
                _ => {}
            }
        }
        problem = written.map_or_else(|| scene.problem().ok(), |written| written.problem(&scene))?;
    }
    for (change, number) in changes() {
        match change {
            Change::Problem(alter) => alter(&mut problem, number),
            Change::OfRight(alter) => alter(&mut problem, &question.exact.end, number),
            Change::Kept(alter) => alter(&mut problem, question.earlier.as_ref()?),
            Change::OfScene(alter) => alter(question.scene.as_ref()?.concrete()?, &mut problem, number),
            _ => {}
        }
    }
    let is_ordered = problem.stages.windows(2).all(|pair| pair[0].end <= pair[1].end);
    let is_known = problem.stages.iter().all(|law| {
        [law.static_force, law.stiffness, law.viscosity, law.drag].iter().all(|coefficient| coefficient.is_finite())
    });
    let is_closed = problem.stages.last().is_some_and(|last| last.end == f64::INFINITY);
    if !(is_ordered
        && is_known
        && is_closed
        && problem.stages[0].end >= 0.0
        && problem.mass > 0.0
        && problem.impact_speed > 0.0
        && problem.exit_depth > 0.0)
    {
        return None;
    }
    let mut rules = Rules::default();
    let (mut is_ruled, mut has_law) = (false, false);
    for (change, number) in changes() {
        match change {
            // Two laws cannot both be the law.
            Change::Force(_) if has_law => return None,
            Change::Force(law) => {
                has_law = true;
                rules.force = (*law, number);
            }
            Change::RestSpeed(of) => rules.rest_speed = of(&problem, number),
            Change::RestPart => rules.rest_part = number,
            Change::EndTime(of) => rules.end_time = of(&question.problem, question.exact.end.time, number),
            Change::StageTime(of) => rules.stage_time = of(&question.problem, number),
            Change::AtStageEnd(alter) => rules.at_stage_end = Some((*alter, number)),
            _ => continue,
        }
        is_ruled = true;
    }
    let mut found = match how {
        How::Exact if !is_ruled => solve(&problem)?,
        How::Exact => simulate(&problem, rules)?,
        How::Scheme(..) if is_ruled => return None,
        How::Scheme(scheme, step) => {
            let end = scheme.end(&problem, step)?;
            let stage = problem.stages.iter().position(|law| end.depth < law.end)?;
            Simulated { end, stage, passed: Vec::new() }
        }
    };
    if let Some((written, scene)) = written.zip(question.scene.as_ref())
        && let Some(square) = written.crater_speed_squared(scene, &problem)
    {
        events::behind_crater(&problem, &mut found, square, written.rests_by_energy);
    }
    for (change, number) in changes() {
        if let Change::Report(alter) = change {
            alter(&problem, &mut found, number);
        }
    }
    found.end.is_finite().then_some((problem, found))
}

/// What causes are compared by: how a flight ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predicted {
    /// Its end.
    pub end: State,
    /// Condition numbers of depth, time and velocity there.
    pub conditions: [f64; 3],
}

/// What solvers with one fault or none answer to a question, by fault, number, scheme and step. It does not depend on what was
/// answered, and causes are looked for several times.
#[derive(Debug, Default)]
pub(super) struct Predictions(Mutex<HashMap<Prediction, Option<Predicted>>>);

/// Bits of the number of the fault at an address, and of the step.
type Prediction = (usize, u64, Option<(Scheme, u64)>);

/// The end of [`predict`].
pub(super) fn predicted(question: &Question, faults: &[Fault<'static>], how: How) -> Option<Predicted> {
    let find = || {
        let (problem, Simulated { end, .. }) = predict(question, faults, how)?;
        Some(Predicted { end, conditions: conditioning(end, &problem) })
    };
    let scheme = match how {
        How::Exact => None,
        How::Scheme(scheme, step) => Some((scheme, step.to_bits())),
    };
    let key = match faults {
        [] => (0, 0, scheme),
        [(fault, number)] => (std::ptr::from_ref(*fault).addr(), number.to_bits(), scheme),
        _ => return find(),
    };
    let known = || question.predicted.0.lock().unwrap_or_else(PoisonError::into_inner);
    let there = known().get(&key).copied();
    // Two threads may compute the same: the lock is not held meanwhile.
    there.unwrap_or_else(|| {
        let found = find();
        known().insert(key, found);
        found
    })
}

const fn of(id: &'static str, statement: &'static str, parameter: Parameter, changes: &'static [Change]) -> Hypothesis {
    Hypothesis { id, statement, parameter, changes }
}

/// `number` to so many significant digits.
fn to_digits(number: f64, digits: f64) -> f64 {
    format!("{number:.*e}", digits as usize - 1).parse().unwrap_or(number)
}

/// Numbers of digits that a number may be rounded to, of stages that are known, and units that a number may be rounded or cut to.
const DIGITS: &[f64] = &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
const COUNTS: &[f64] = &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
const GRAINS: &[f64] = &[1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e6];
fn to_grain(number: f64, grain: f64) -> f64 {
    (number / grain).round() * grain
}

/// `number` as one of single precision.
fn to_single(number: f64) -> f64 {
    f64::from(number as f32)
}

/// A number on each side of every one of `cuts`, ascending.
fn between(mut cuts: Vec<f64>) -> Vec<f64> {
    cuts.retain(|cut| *cut > 0.0 && cut.is_finite());
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let Some((first, last)) = cuts.first().zip(cuts.last()) else { return vec![1.0] };
    let (below, above) = (0.5 * first, 2.0 * last);
    let inner = cuts.windows(2).map(|pair| (pair[0] * pair[1]).sqrt());
    std::iter::once(below).chain(inner).chain([above]).collect()
}

/// Every hypothesis.
pub(super) fn hypotheses() -> impl Iterator<Item = &'static Hypothesis> {
    force::TERMS
        .iter()
        .flatten()
        .chain(force::FAULTS)
        .chain(force::BY_MASS.iter().flatten())
        .chain(force::SMOOTHED.iter().flatten())
        .chain(force::ROUNDED.iter().chain(&report::ROUNDED).flatten())
        .chain(force::BOUNDED.iter().chain(&report::BOUNDED).flatten())
        .chain(events::FAULTS)
        .chain(report::FAULTS)
        .chain(report::TIMES.iter().flatten())
        .chain(report::UNEVEN_TIMES.iter().flatten())
        .chain(scene::FAULTS)
        .chain(formulas::FAULTS)
        .chain(neighbours::FAULTS.iter().flatten())
        .chain(spread::PARTS.iter().flatten())
        .chain(&spread::LENGTHS)
        .chain(force::EARLIER)
}

impl Hypothesis {
    /// Whether it is about a solver that reads the scene.
    pub(super) fn needs_scene(&self) -> bool {
        self.changes.iter().any(|change| matches!(change, Change::Scene(_) | Change::Written(_) | Change::OfScene(_)))
    }

    /// Whether it has a force of its own.
    pub(super) fn has_law(&self) -> bool {
        self.changes.iter().any(|change| matches!(change, Change::Force(_)))
    }

    /// The sentence with the number in it.
    pub(super) fn says(&self, number: f64) -> String {
        // As many digits as tell the number from one, and those of a fit.
        let digits = 5 - (number - 1.0).abs().clamp(1e-11, 1.0).log10().floor() as i32;
        let nearest = number.round();
        let shown = if (number - nearest).abs() < 1e-12 && nearest.abs() < 1e6 {
            format!("{nearest}")
        } else {
            crate::text::digits_text(number, digits)
        };
        if number == 0.0 && matches!(self.parameter, Parameter::Factor) {
            return self.statement.replacen("is {} times the right one", "is left out", 1).replacen("{}", "0", 1);
        }
        self.statement.replacen("{}", &shown, 1)
    }
}

/// A cause that is known by what it would answer.
#[cfg(feature = "report")]
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
pub struct KnownCause {
    /// Id (`docs/reference.md`, "Diagnosis").
    pub id: &'static str,
    /// What is wrong, with a number as it may be.
    pub statement: String,
    /// What a solver with it reads: `stages`, which every solver may, or `scene`.
    pub reads: &'static str,
    /// What a solver that is right but for it answers.
    pub effects: Vec<Effect>,
}

/// What a fault makes of one question.
#[cfg(feature = "report")]
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
pub struct Effect {
    /// Name of the question.
    pub question: String,
    /// What its flight meets.
    pub contains: Vec<Content>,
    /// The right end.
    pub right: State,
    /// The end with the fault.
    pub answer: State,
    /// Relative differences, of the velocity over V0.
    pub relative_error: Each,
}

/// Every cause that is known by what it would answer, with what it makes of the first `effects` of `count` questions from `seed`
/// that it concerns. One that no flight shows has none.
#[cfg(feature = "report")]
pub fn known_causes(seed: u64, count: usize, effects: usize) -> Vec<KnownCause> {
    let of_stages_and_of_scenes = [false, true].map(|of_scenes| questions(seed, count, of_scenes));
    let known = |fault: &'static Hypothesis| {
        let number = fault.parameter.example();
        let effect = |question: &Question| {
            let number = fault.parameter.own_example(question).unwrap_or(number);
            let (_, Simulated { end: answer, .. }) = predict(question, &[(fault, number)], How::Exact)?;
            let right = question.exact.end;
            let off = errors(answer, right, question.problem.impact_speed);
            let is_concerned =
                off.iter().zip(question.conditions).any(|(off, condition)| off.abs() > SHOWN * condition);
            is_concerned.then(|| Effect {
                question: question.id.clone(),
                contains: question.contains.clone(),
                right,
                answer,
                relative_error: Each::of(off),
            })
        };
        let asked = of_stages_and_of_scenes[usize::from(fault.needs_scene())].iter();
        let usable = asked.filter(|question| question.problem.impact_speed > 0.0 && !question.is_on_a_border());
        KnownCause {
            id: fault.id,
            statement: fault.says(number),
            reads: if fault.needs_scene() { "scene" } else { "stages" },
            effects: usable.filter_map(effect).take(effects).collect(),
        }
    };
    hypotheses().collect::<Vec<_>>().into_par_iter().map(known).collect()
}

/// A difference over its condition that is no rounding.
#[cfg(feature = "report")]
const SHOWN: f64 = 1e-9;

/// Faults that change an answer at the very number at which nothing is wrong, as sentences, and how many answers were looked at:
/// to `count` questions about stages and as many about scenes. A fault with another number would be named with a wrong one.
#[cfg(feature = "report")]
pub(crate) fn changed_by_nothing(seed: u64, count: usize) -> (usize, Vec<String>) {
    const LEFT: f64 = 1e-7;
    let all: Vec<Question> =
        [false, true].into_iter().flat_map(|of_scenes| questions(seed, count, of_scenes)).collect();
    let usable = all.iter().filter(|question| question.problem.impact_speed > 0.0 && !question.is_on_a_border());
    let usable: Vec<&Question> = usable.collect();
    let (mut answers, mut changed) = (0, Vec::new());
    for fault in hypotheses() {
        let numbers = fault.parameter.neutral();
        let mut is_changed = |question: &&Question, number: f64| {
            let Some((problem, found)) = predict(question, &[(fault, number)], How::Exact) else {
                return false;
            };
            answers += 1;
            let off = errors(found.end, question.exact.end, problem.impact_speed);
            (0..3).any(|i| !(off[i].abs() <= LEFT * question.conditions[i]))
        };
        let by: Option<Vec<&&Question>> =
            numbers.iter().map(|number| usable.iter().find(|question| is_changed(question, *number))).collect();
        if let Some((question, number)) = by.and_then(|by| Some((*by.first()?, *numbers.first()?))) {
            changed.push(format!("{} ({})", fault.says(number), question.id));
        }
    }
    (answers, changed)
}
