//! Faults of the force: its terms, which stage they are of, and what is added or left out.

use super::super::questions::Question;
use super::super::simulation::{Place, Simulated, right_force};
use super::{Change, DIGITS, GRAINS, Hypothesis, Parameter, of, to_digits, to_grain, to_single};
use crate::physics::{Problem, Stage};

/// Stages that a fault concerns: all, the first, all but the first, those behind the second, the last, all but the last.
const ALL: u8 = 0;
const FIRST: u8 = 1;
const LATER: u8 = 2;
const LAST: u8 = 3;
const THIRD: u8 = 4;
const BUT_LAST: u8 = 5;

fn is_in(part: u8, index: usize, count: usize) -> bool {
    match part {
        FIRST => index == 0,
        LATER => index > 0,
        THIRD => index > 1,
        LAST => index + 1 == count,
        BUT_LAST => index + 1 < count,
        _ => true,
    }
}

/// Terms of the force; a drive is a static force below zero, softening a stiffness below zero.
pub(super) const STATIC_FORCE: u8 = 0;
pub(super) const STIFFNESS: u8 = 1;
pub(super) const VISCOSITY: u8 = 2;
pub(super) const DRAG: u8 = 3;
const DRIVE: u8 = 4;
const SOFTENING: u8 = 5;

/// The `TERM` of the force times `factor` in a `PART` of the stages.
fn scale_term<const TERM: u8, const PART: u8>(problem: &mut Problem, factor: f64) {
    let count = problem.stages.len();
    for (index, law) in problem.stages.iter_mut().enumerate() {
        let term = term_of(law, TERM);
        if is_in(PART, index, count) && (TERM < DRIVE || *term < 0.0) {
            *term *= factor;
        }
    }
}

/// The greatest depth (m) of an end of a stage or the exit, if there is any.
pub(super) fn greatest_end(problem: &Problem) -> Option<f64> {
    let ends = problem.stages.iter().map(|law| law.end).chain([problem.exit_depth]);
    ends.filter(|end| end.is_finite()).reduce(f64::max)
}

/// The mass times `factor` in a `PART` of the stages: the same as all forces over it.
fn scale_mass<const PART: u8>(problem: &mut Problem, factor: f64) {
    if factor <= 0.0 {
        // No flight has such a mass.
        problem.mass = factor;
        return;
    }
    let count = problem.stages.len();
    for (_, law) in problem.stages.iter_mut().enumerate().filter(|(index, _)| is_in(PART, *index, count)) {
        *law = law.per_mass(factor);
    }
}

/// `factor` times the weight added in a `PART` of the stages.
fn add_weight<const PART: u8>(problem: &mut Problem, factor: f64) {
    let (count, weight) = (problem.stages.len(), problem.mass * GRAVITY);
    for (index, law) in problem.stages.iter_mut().enumerate() {
        if is_in(PART, index, count) {
            law.static_force += factor * weight;
        }
    }
}

/// Where a stage may take a coefficient from, in place of its own.
const PREVIOUS: u8 = 0;
const NEXT: u8 = 1;
const OF_FIRST: u8 = 2;
const OF_LAST: u8 = 3;
const MEAN: u8 = 4;
const KEPT: u8 = 5;
const PREVIOUS_IN_TURN: u8 = 6;
const NEXT_IN_TURN: u8 = 7;
const SUM: u8 = 8;

pub(super) fn term_of(law: &mut Stage, term: u8) -> &mut f64 {
    match term {
        STIFFNESS | SOFTENING => &mut law.stiffness,
        VISCOSITY => &mut law.viscosity,
        DRAG => &mut law.drag,
        _ => &mut law.static_force,
    }
}

/// The `term` of every stage taken from where `from` says.
fn borrow(problem: &mut Problem, term: u8, from: u8) {
    let own: Vec<f64> = problem.stages.iter_mut().map(|law| *term_of(law, term)).collect();
    let mut kept = 0.0;
    for (index, law) in problem.stages.iter_mut().enumerate() {
        let before = own[index.saturating_sub(1)];
        if own[index] != 0.0 {
            kept = own[index];
        }
        *term_of(law, term) = match from {
            PREVIOUS => before,
            NEXT => own[(index + 1).min(own.len() - 1)],
            OF_FIRST => own[0],
            OF_LAST => own[own.len() - 1],
            MEAN => 0.5 * (before + own[index]),
            PREVIOUS_IN_TURN => own[(index + own.len() - 1) % own.len()],
            NEXT_IN_TURN => own[(index + 1) % own.len()],
            SUM => own[..=index].iter().sum(),
            _ => kept,
        };
    }
}

fn borrow_term<const TERM: u8, const FROM: u8>(problem: &mut Problem, _: f64) {
    borrow(problem, TERM, FROM);
}

/// `TERM` without any other in the stages that have it.
fn leave_alone<const TERM: u8>(problem: &mut Problem, _: f64) {
    for law in &mut problem.stages {
        let own = *term_of(law, TERM);
        if own != 0.0 {
            *law = Stage::free().until(law.end);
            *term_of(law, TERM) = own;
        }
    }
}

/// No `TERM` in the stages that have the `OTHER`.
fn leave_out_beside<const TERM: u8, const OTHER: u8>(problem: &mut Problem, _: f64) {
    for law in &mut problem.stages {
        if *term_of(law, OTHER) != 0.0 {
            *term_of(law, TERM) = 0.0;
        }
    }
}

/// The number of `TERM` in every stage as `alter` has it.
fn alter_term<const TERM: u8>(problem: &mut Problem, alter: impl Fn(f64) -> f64) {
    for law in &mut problem.stages {
        let term = term_of(law, TERM);
        *term = alter(*term);
    }
}

/// The numbers of `TERM` that a question has.
fn numbers_of<const TERM: u8>(question: &Question) -> Vec<f64> {
    question.problem.stages.iter().map(|law| *term_of(&mut law.clone(), TERM)).collect()
}

/// One term of the force at a place.
fn part_of(at: &Place<'_>, term: u8) -> f64 {
    match term {
        STIFFNESS => at.law.stiffness * at.depth,
        VISCOSITY => at.law.viscosity * at.velocity,
        DRAG => at.law.drag * at.velocity * at.velocity,
        _ => at.law.static_force,
    }
}

/// The force with `TERM` as `alter` has it.
fn with_term<const TERM: u8>(at: &Place<'_>, alter: impl Fn(f64) -> f64) -> f64 {
    let part = part_of(at, TERM);
    right_force(at, 1.0) + (alter(part) - part)
}

/// The force without `TERM` where the velocity is below, or else above, `speed`.
fn without_term<const TERM: u8, const IS_BELOW: bool>(at: &Place<'_>, speed: f64) -> f64 {
    with_term::<TERM>(at, |part| if (at.velocity < speed) == IS_BELOW { 0.0 } else { part })
}

/// The force as it is at another velocity.
fn at_velocity(at: &Place<'_>, velocity: f64) -> f64 {
    right_force(&Place { velocity, ..*at }, 1.0)
}

/// The stiffness of stages as a static force, that at a part of their way; an endless stage has none but at its start.
pub(super) fn spring_at(problem: &mut Problem, part: f64, is_one: impl Fn(&Stage) -> bool) {
    for index in 0..problem.stages.len() {
        let (start, law) = (problem.start_of(index), &mut problem.stages[index]);
        if is_one(law) && (part == 0.0 || law.end.is_finite()) {
            let depth = if part == 0.0 { start } else { start + part * (law.end - start) };
            law.static_force += law.stiffness * depth;
            law.stiffness = 0.0;
        }
    }
}

/// The force near the start of a stage as one that goes over from the stage before.
fn blended(at: &Place<'_>, from: f64, to: f64) -> f64 {
    let own = right_force(at, 1.0);
    let share = |border: f64| ((at.depth - border - from) / (to - from)).clamp(0.0, 1.0);
    let other = |index: usize| at.problem.stages[index].force(at.depth, at.velocity);
    let last = at.problem.stages.len() - 1;
    let behind = if at.index > 0 { share(at.problem.start_of(at.index)) } else { 1.0 };
    let before = if at.index < last { share(at.law.end) } else { 0.0 };
    if behind < 1.0 {
        return own * behind + other(at.index - 1) * (1.0 - behind);
    }
    if before > 0.0 { own * (1.0 - before) + other(at.index + 1) * before } else { own }
}

/// Two terms exchanged in every stage from the `first` on.
fn exchange(problem: &mut Problem, first: usize, one: u8, other: u8) {
    for law in problem.stages.iter_mut().skip(first) {
        let (a, b) = (*term_of(law, one), *term_of(law, other));
        (*term_of(law, one), *term_of(law, other)) = (b, a);
    }
}

/// The force with another power than V² behind q.
fn with_drag(at: &Place<'_>, power: f64) -> f64 {
    let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
    static_force + stiffness * at.depth + viscosity * at.velocity + drag * power
}

/// The force with another power than V behind r.
fn with_viscosity(at: &Place<'_>, power: f64) -> f64 {
    let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
    static_force + stiffness * at.depth + viscosity * power + drag * at.velocity * at.velocity
}

/// The laws of all stages, their ends left where they are, replaced by `law` of the index and the count.
pub(super) fn reorder(problem: &mut Problem, law: impl Fn(usize, usize) -> usize) {
    let laws = problem.stages.clone();
    for (index, stage) in problem.stages.iter_mut().enumerate() {
        *stage = laws[law(index, laws.len()).min(laws.len() - 1)].until(stage.end);
    }
}

/// The problem as it is seen from `depth`: what lies before it is left out.
fn start_at(problem: &mut Problem, depth: f64) {
    problem.exit_depth -= depth;
    for law in &mut problem.stages {
        law.static_force += law.stiffness * depth;
        law.end = (law.end - depth).max(0.0);
    }
}

/// Standard gravity (m/s²).
const GRAVITY: f64 = 9.80665;

fn single_inputs(problem: &mut Problem, _: f64) {
    problem.mass = to_single(problem.mass);
    problem.impact_speed = to_single(problem.impact_speed);
    problem.exit_depth = to_single(problem.exit_depth);
    for law in &mut problem.stages {
        *law = law.map(to_single);
    }
}

fn single_coefficients(problem: &mut Problem) {
    problem.stages.iter_mut().for_each(|law| *law = law.map(to_single).until(law.end));
}

/// What is slower than `speed` is reported as at rest.
pub(super) fn clear_speed(found: &mut Simulated, speed: f64) {
    if found.end.velocity <= speed {
        found.end.velocity = 0.0;
    }
}

fn add_force(problem: &mut Problem, force: f64) {
    problem.stages.iter_mut().for_each(|law| law.static_force += force);
}

/// A term of the force, in all stages and in a part of them.
macro_rules! term {
    ($id:literal, $what:literal, $term:ident, $usual:literal, $clip:literal) => {
        [
            of(
                $id,
                concat!($what, " is {} times the right one"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, ALL>)],
            ),
            of(
                $id,
                concat!($what, " is {} times the right one in the first stage alone"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, FIRST>)],
            ),
            of(
                $id,
                concat!($what, " is {} times the right one in every stage but the first"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, LATER>)],
            ),
            of(
                $id,
                concat!($what, " is {} times the right one in every stage behind the second"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, THIRD>)],
            ),
            of(
                $id,
                concat!($what, " is {} times the right one in the last stage alone"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, LAST>)],
            ),
            of(
                $id,
                concat!($what, " is {} times the right one in every stage but the last"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, BUT_LAST>)],
            ),
            of(
                $id,
                concat!($what, " of the stage before is used"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, PREVIOUS>)],
            ),
            of(
                $id,
                concat!($what, " of the next stage is used"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, NEXT>)],
            ),
            of(
                $id,
                concat!($what, " of the stage before is used, in the first that of the last"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, PREVIOUS_IN_TURN>)],
            ),
            of(
                $id,
                concat!($what, " of the next stage is used, in the last that of the first"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, NEXT_IN_TURN>)],
            ),
            of(
                $id,
                concat!($what, " adds up from stage to stage"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, SUM>)],
            ),
            of(
                "term-alone",
                concat!("no other force acts in a stage that has ", $what),
                Parameter::None,
                &[Change::Problem(leave_alone::<$term>)],
            ),
            of(
                $id,
                concat!($what, " of the first stage is used in all"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, OF_FIRST>)],
            ),
            of(
                $id,
                concat!($what, " of the last stage is used in all"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, OF_LAST>)],
            ),
            of(
                $id,
                concat!($what, " keeps the value of the stage before where it is zero"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, KEPT>)],
            ),
            of(
                $id,
                concat!($what, " is the mean of this stage's and that of the stage before"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, MEAN>)],
            ),
            of(
                "input-clipped",
                concat!($what, " is at most {}"),
                Parameter::Value($usual),
                &[Change::Problem(|p, n| alter_term::<$term>(p, |own| own.min(n)))],
            ),
            of(
                "input-clipped",
                concat!($what, " is at least {}"),
                Parameter::Value($usual),
                &[Change::Problem(|p, n| alter_term::<$term>(p, |own| own.max(n)))],
            ),
            of(
                "input-clipped",
                concat!($what, " counts as zero below {}"),
                Parameter::Threshold($usual, numbers_of::<$term>),
                &[Change::Problem(|p, n| alter_term::<$term>(p, |own| if own < n { 0.0 } else { own }))],
            ),
            of(
                $clip,
                concat!($what, " gives at most {} N"),
                Parameter::Value(1e3),
                &[Change::Force(|at, n| with_term::<$term>(at, |part| part.min(n)))],
            ),
            of(
                $clip,
                concat!($what, " gives at least {} N"),
                Parameter::Value(1e3),
                &[Change::Force(|at, n| with_term::<$term>(at, |part| part.max(n)))],
            ),
            of(
                $id,
                concat!($what, " is left out below {} m/s"),
                Parameter::Speed,
                &[Change::Force(without_term::<$term, true>)],
            ),
        ]
    };
}

/// Faults of single terms.
pub(super) static TERMS: [[Hypothesis; 22]; 4] = [
    term!("term:static-force", "the static force p", STATIC_FORCE, 1e3, "input-clipped"),
    term!("term:stiffness", "the stiffness s", STIFFNESS, 1e4, "force-clipped"),
    term!("term:viscosity", "the viscosity r", VISCOSITY, 1e2, "force-clipped"),
    term!("term:drag", "the drag q", DRAG, 1.0, "force-clipped"),
];

/// A term that meets the mass once too often or once too rarely.
macro_rules! by_mass {
    ($id:literal, $what:literal, $term:ident) => {
        [
            of(
                $id,
                concat!($what, " is divided by the mass in kg, which the equation does too"),
                Parameter::None,
                &[Change::Problem(|p, _| scale_term::<$term, ALL>(p, 1.0 / p.mass))],
            ),
            of(
                $id,
                concat!($what, " is not divided by the mass"),
                Parameter::None,
                &[Change::Problem(|p, _| scale_term::<$term, ALL>(p, p.mass))],
            ),
            of(
                $id,
                concat!($what, " has the greatest depth of an end or the exit, in m, as a factor: it is not made dimensionless as the others"),
                Parameter::None,
                &[Change::Problem(|p, _| scale_term::<$term, ALL>(p, greatest_end(p).unwrap_or(f64::NAN)))],
            ),
            of(
                $id,
                concat!($what, " is divided by the greatest depth of an end or the exit, in m: it is not made dimensionless as the others"),
                Parameter::None,
                &[Change::Problem(|p, _| scale_term::<$term, ALL>(p, 1.0 / greatest_end(p).unwrap_or(f64::NAN)))],
            ),
            of(
                $id,
                concat!($what, " has V0, in m/s, as a factor: it is not made dimensionless as the others"),
                Parameter::None,
                &[Change::Problem(|p, _| scale_term::<$term, ALL>(p, p.impact_speed))],
            ),
            of(
                $id,
                concat!($what, " is divided by V0, in m/s: it is not made dimensionless as the others"),
                Parameter::None,
                &[Change::Problem(|p, _| scale_term::<$term, ALL>(p, 1.0 / p.impact_speed))],
            ),
        ]
    };
}

/// Terms with the mass, a length or a speed in the wrong place.
pub(super) static BY_MASS: [[Hypothesis; 6]; 4] = [
    by_mass!("term:static-force", "the static force p", STATIC_FORCE),
    by_mass!("term:stiffness", "the stiffness s", STIFFNESS),
    by_mass!("term:viscosity", "the viscosity r", VISCOSITY),
    by_mass!("term:drag", "the drag q", DRAG),
];

/// A static force that vanishes at rest, by several thresholds of rest.
macro_rules! smoothed {
    ($formula:literal, |$at:ident, $speed:ident| $share:expr) => {
        [
            smoothed!($formula, "a hundredth", 1e-2, |$at, $speed| $share),
            smoothed!($formula, "a thousandth", 1e-3, |$at, $speed| $share),
            smoothed!($formula, "a ten thousandth", 1e-4, |$at, $speed| $share),
            smoothed!($formula, "a millionth", 1e-6, |$at, $speed| $share),
        ]
    };
    ($formula:literal, $words:literal, $part:literal, |$at:ident, $speed:ident| $share:expr) => {
        of(
            "force-smoothed",
            concat!("the static force is ", $formula, ", with rest at ", $words, " of that speed"),
            Parameter::Speed,
            &[
                Change::Force(|$at, $speed| with_term::<STATIC_FORCE>($at, |part| part * $share)),
                Change::RestSpeed(|_, speed| $part * speed),
                Change::Report(|_, found, speed| clear_speed(found, $part * speed)),
            ],
        )
    };
}

/// Static forces that vanish at rest.
pub(super) static SMOOTHED: [[Hypothesis; 4]; 3] = [
    smoothed!("p tanh(V/{} m/s)", |at, n| (at.velocity / n).tanh()),
    smoothed!("p V/sqrt(V² + v²) with v = {} m/s", |at, n| at.velocity / at.velocity.hypot(n)),
    smoothed!("p min(V/{} m/s, 1)", |at, n| (at.velocity / n).min(1.0)),
];

/// Inputs that are rounded.
pub(super) static ROUNDED: [[Hypothesis; 4]; 3] = [
    rounded!("input-rounded", "the mass", "kg", Problem(p; n) p.mass),
    rounded!("input-rounded", "the impact speed", "m/s", Problem(p; n) p.impact_speed),
    rounded!("input-rounded", "the exit depth", "m", Problem(p; n) p.exit_depth),
];

/// Inputs that are bounded.
pub(super) static BOUNDED: [[Hypothesis; 2]; 2] = [
    bounded!("input-clipped", "the mass", "kg", 1.0, Problem(p; n) p.mass),
    bounded!("input-clipped", "the impact speed", "m/s", 30.0, Problem(p; n) p.impact_speed),
];

/// Every other fault of the force, the mass and the impact speed.
pub(super) static FAULTS: &[Hypothesis] = &[
    of("term:mass", "the mass is {} times the right one", Parameter::Factor, &[Change::Problem(|p, f| p.mass *= f)]),
    of(
        "impact-speed",
        "the impact speed is {} times the right one",
        Parameter::Factor,
        &[Change::Problem(|p, f| p.impact_speed *= f)],
    ),
    of(
        "impact-speed",
        "the impact speed is {} m/s too high",
        Parameter::Offset,
        &[Change::Problem(|p, by| p.impact_speed += by)],
    ),
    of("term:mass", "the mass is {} kg too large", Parameter::Offset, &[Change::Problem(|p, by| p.mass += by)]),
    of(
        "mass-changes",
        "the mass falls with the depth as exp(-{} x/m)",
        Parameter::Offset,
        &[Change::Force(|at, n| right_force(at, n) * (n * at.depth).exp())],
    ),
    of(
        "mass-changes",
        "the mass falls with the depth as 1 - {} x/m",
        Parameter::Offset,
        &[Change::Force(|at, n| right_force(at, n) / (1.0 - n * at.depth))],
    ),
    of(
        "offset",
        "the flight starts at x = {} m, and not at the impact face",
        Parameter::Value(1e-4),
        &[Change::Problem(start_at), Change::Report(|_, found, at| found.end.depth += at)],
    ),
    of(
        "term:first-stage",
        "the first of several stages has its stiffness alone",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if p.stages.len() > 1 {
                p.stages[0] = Stage { static_force: 0.0, viscosity: 0.0, drag: 0.0, ..p.stages[0] };
            }
        })],
    ),
    of(
        "term:mass",
        "the mass is {} times the right one in the first stage alone",
        Parameter::Factor,
        &[Change::Problem(scale_mass::<FIRST>)],
    ),
    of(
        "term:mass",
        "the mass is {} times the right one in every stage but the first",
        Parameter::Factor,
        &[Change::Problem(scale_mass::<LATER>)],
    ),
    of(
        "term:mass",
        "the mass is {} times the right one in the last stage alone",
        Parameter::Factor,
        &[Change::Problem(scale_mass::<LAST>)],
    ),
    of("term:mass", "the mass is left out: M = 1 kg", Parameter::None, &[Change::Problem(|p, _| p.mass = 1.0)]),
    of(
        "term:mass",
        "the mass is left out in the first stage: M = 1 kg there",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let mass = p.mass;
            let Stage { static_force, stiffness, viscosity, drag, end } = p.stages[0];
            p.stages[0] = Stage {
                static_force: static_force * mass,
                stiffness: stiffness * mass,
                viscosity: viscosity * mass,
                drag: drag * mass,
                end,
            };
        })],
    ),
    of(
        "extra-force",
        "the weight M g is added to the resistance, times {}",
        Parameter::Factor,
        &[Change::Problem(add_weight::<ALL>)],
    ),
    of(
        "extra-force",
        "the weight M g is added to the resistance in the first stage alone, times {}",
        Parameter::Factor,
        &[Change::Problem(add_weight::<FIRST>)],
    ),
    of(
        "extra-force",
        "the weight M g is added to the resistance in every stage but the first, times {}",
        Parameter::Factor,
        &[Change::Problem(add_weight::<LATER>)],
    ),
    of(
        "extra-force",
        "the weight M g is added to the resistance in the last stage alone, times {}",
        Parameter::Factor,
        &[Change::Problem(add_weight::<LAST>)],
    ),
    of(
        "extra-force",
        "the weight M g is added to the resistance in every stage but the last, times {}",
        Parameter::Factor,
        &[Change::Problem(add_weight::<BUT_LAST>)],
    ),
    of(
        "extra-force",
        "a constant force of {} N is added to the resistance",
        Parameter::Unit,
        &[Change::Problem(add_force)],
    ),
    of(
        "input-rounded",
        "ends of stages are rounded to a multiple of {} m",
        Parameter::OneOf(GRAINS),
        &[Change::Problem(|p, grain| {
            p.stages.iter_mut().filter(|law| law.end.is_finite()).for_each(|law| law.end = to_grain(law.end, grain));
        })],
    ),
    of(
        "input-rounded",
        "the mass is rounded: another factor near 1 in every answer",
        Parameter::Nearness,
        &[Change::Problem(|p, f| p.mass *= f)],
    ),
    of(
        "input-rounded",
        "the impact speed is rounded: another factor near 1 in every answer",
        Parameter::Nearness,
        &[Change::Problem(|p, f| p.impact_speed *= f)],
    ),
    of(
        "drag-power",
        "the drag q is multiplied by V^{}, not by V²",
        Parameter::Exponent(2.0),
        &[Change::Force(|at, n| with_drag(at, at.velocity.abs().powf(n)))],
    ),
    of(
        "drag-power",
        "the drag is q V0² (V/V0)^{}, not q V²",
        Parameter::Exponent(2.0),
        &[Change::Force(|at, n| {
            with_drag(at, at.impact_speed * at.impact_speed * (at.velocity.abs() / at.impact_speed).powf(n))
        })],
    ),
    of(
        "viscosity-power",
        "the viscosity r is multiplied by V^{}, not by V",
        Parameter::Exponent(1.0),
        &[Change::Force(|at, n| with_viscosity(at, at.velocity.abs().powf(n)))],
    ),
    of(
        "stiffness-power",
        "the stiffness s is multiplied by x^{}, not by x",
        Parameter::Exponent(1.0),
        &[Change::Force(|at, n| {
            let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
            static_force + stiffness * at.depth.abs().powf(n) + (viscosity + drag * at.velocity) * at.velocity
        })],
    ),
    of(
        "force-stale",
        "the force that depends on V is that of the impact speed throughout",
        Parameter::None,
        &[Change::Force(|at, _| right_force(&Place { velocity: at.impact_speed, ..*at }, 1.0))],
    ),
    of(
        "term:drag",
        "the drag q is left out in stages that have stiffness",
        Parameter::None,
        &[Change::Problem(leave_out_beside::<DRAG, STIFFNESS>)],
    ),
    of(
        "term:viscosity",
        "the viscosity r is left out in stages that have stiffness",
        Parameter::None,
        &[Change::Problem(leave_out_beside::<VISCOSITY, STIFFNESS>)],
    ),
    of(
        "drag-on-viscosity",
        "the drag is left out where there is viscosity",
        Parameter::None,
        &[Change::Problem(leave_out_beside::<DRAG, VISCOSITY>)],
    ),
    of(
        "drag-on-viscosity",
        "the viscosity is left out where there is drag",
        Parameter::None,
        &[Change::Problem(leave_out_beside::<VISCOSITY, DRAG>)],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the start of the stage, not from the impact face",
        Parameter::None,
        &[Change::Problem(|p, _| {
            for index in 1..p.stages.len() {
                let start = p.start_of(index);
                p.stages[index].static_force -= p.stages[index].stiffness * start;
            }
        })],
    ),
    of(
        "stage-order",
        "the stages are taken in the opposite order",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |index, count| count - 1 - index))],
    ),
    of(
        "stage-order",
        "each stage has the law of the next one",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |index, _| index + 1))],
    ),
    of(
        "stage-order",
        "each stage has the law of the one before",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |index, _| index.saturating_sub(1)))],
    ),
    of(
        "stage-order",
        "the law of the last stage holds from the start",
        Parameter::None,
        &[Change::Problem(|p, _| reorder(p, |_, count| count - 1))],
    ),
    of(
        "stage-order",
        "the last stage has the law of the one before",
        Parameter::None,
        &[Change::Problem(|p, _| {
            reorder(p, |index, count| if index + 1 == count { index.saturating_sub(1) } else { index });
        })],
    ),
    of(
        "terms-exchanged",
        "viscosity r and drag q are exchanged",
        Parameter::None,
        &[Change::Problem(|p, _| exchange(p, 0, VISCOSITY, DRAG))],
    ),
    of(
        "terms-exchanged",
        "viscosity r and drag q are exchanged in every stage but the first",
        Parameter::None,
        &[Change::Problem(|p, _| exchange(p, 1, VISCOSITY, DRAG))],
    ),
    of(
        "terms-exchanged",
        "static force p and stiffness s are exchanged",
        Parameter::None,
        &[Change::Problem(|p, _| exchange(p, 0, STATIC_FORCE, STIFFNESS))],
    ),
    of(
        "terms-exchanged",
        "stiffness s and viscosity r are exchanged",
        Parameter::None,
        &[Change::Problem(|p, _| exchange(p, 0, STIFFNESS, VISCOSITY))],
    ),
    of(
        "stage-order",
        "a coefficient that is zero keeps the value of the stage before",
        Parameter::None,
        &[Change::Problem(|p, _| {
            for term in [STATIC_FORCE, STIFFNESS, VISCOSITY, DRAG] {
                borrow(p, term, KEPT);
            }
        })],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the start of the stage before",
        Parameter::None,
        &[Change::Problem(|p, _| {
            for index in 2..p.stages.len() {
                let start = p.start_of(index - 1);
                p.stages[index].static_force -= p.stages[index].stiffness * start;
            }
        })],
    ),
    of(
        "extra-force",
        "a force of {} /s times M V is added to the resistance",
        Parameter::Value(0.3),
        &[Change::Force(|at, n| right_force(at, n) + n * at.mass * at.velocity)],
    ),
    of(
        "extra-force",
        "a force of {} kg/s times V is added to the resistance",
        Parameter::Value(0.3),
        &[Change::Force(|at, n| right_force(at, n) + n * at.velocity)],
    ),
    of(
        "extra-force",
        "a force of {} kg/m times V² is added to the resistance",
        Parameter::Value(0.3),
        &[Change::Force(|at, n| right_force(at, n) + n * at.velocity * at.velocity)],
    ),
    of(
        "extra-force",
        "a force of {} N/m times x is added to the resistance",
        Parameter::Value(0.3),
        &[Change::Force(|at, n| right_force(at, n) + n * at.depth)],
    ),
    of(
        "force-clipped",
        "a force below {} N in size counts as zero",
        Parameter::Value(1e3),
        &[Change::Force(|at, n| Some(right_force(at, n)).filter(|force| force.abs() >= n).unwrap_or(0.0))],
    ),
    of(
        "force-clipped",
        "a force that drives counts as zero",
        Parameter::None,
        &[Change::Force(|at, n| right_force(at, n).max(0.0))],
    ),
    of(
        "force-clipped",
        "the force is at most {} N",
        Parameter::Value(0.3),
        &[Change::Force(|at, n| right_force(at, n).min(n))],
    ),
    of(
        "force-clipped",
        "the deceleration is at most {} m/s²",
        Parameter::Value(0.3),
        &[Change::Force(|at, n| right_force(at, n).min(n * at.mass))],
    ),
    of(
        "force-stale",
        "the drag is q V V1, with V1 of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| with_drag(at, at.velocity * at.entry_speed))],
    ),
    of(
        "force-stale",
        "the drag is q V1², with V1 of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| with_drag(at, at.entry_speed * at.entry_speed))],
    ),
    of(
        "force-stale",
        "the viscous force is r V0",
        Parameter::None,
        &[Change::Force(|at, _| with_viscosity(at, at.impact_speed))],
    ),
    of(
        "force-stale",
        "the viscous force is r V1, with V1 of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| with_viscosity(at, at.entry_speed))],
    ),
    of(
        "input-clipped",
        "the exit depth is at most {} m",
        Parameter::Value(0.1),
        &[Change::Problem(|p, n| {
            if p.has_exit() {
                p.exit_depth = p.exit_depth.min(n);
            }
        })],
    ),
    of(
        "input-clipped",
        "the exit depth is at least {} m",
        Parameter::Value(0.1),
        &[Change::Problem(|p, n| {
            if p.has_exit() {
                p.exit_depth = p.exit_depth.max(n);
            }
        })],
    ),
    of(
        "input-rounded",
        "ends of stages are rounded to single precision",
        Parameter::None,
        &[Change::Problem(|p, _| p.stages.iter_mut().for_each(|law| law.end = to_single(law.end)))],
    ),
    of(
        "input-rounded",
        "exit and ends of stages are rounded to a multiple of {} m",
        Parameter::OneOf(GRAINS),
        &[Change::Problem(|p, grain| {
            p.exit_depth = to_grain(p.exit_depth, grain);
            p.stages.iter_mut().for_each(|law| law.end = to_grain(law.end, grain));
        })],
    ),
    of(
        "input-rounded",
        "every input is rounded to single precision",
        Parameter::None,
        &[Change::Problem(single_inputs)],
    ),
    of(
        "force-stale",
        "the drag is q V V0",
        Parameter::None,
        &[Change::Force(|at, _| with_drag(at, at.velocity * at.impact_speed))],
    ),
    of(
        "force-stale",
        "the drag is q V0²",
        Parameter::None,
        &[Change::Force(|at, _| with_drag(at, at.impact_speed * at.impact_speed))],
    ),
    of(
        "force-stale",
        "the drag is q times the square of the mean of V and V1, that of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| with_drag(at, (0.5 * (at.velocity + at.entry_speed)).powi(2)))],
    ),
    of(
        "force-stale",
        "the drag is q times the square of the mean of V and V0",
        Parameter::None,
        &[Change::Force(|at, _| with_drag(at, (0.5 * (at.velocity + at.impact_speed)).powi(2)))],
    ),
    of(
        "force-stale",
        "the viscous force is r times the mean of V and V1, that of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| with_viscosity(at, 0.5 * (at.velocity + at.entry_speed)))],
    ),
    of(
        "force-stale",
        "the viscous force is r times the mean of V and V0",
        Parameter::None,
        &[Change::Force(|at, _| with_viscosity(at, 0.5 * (at.velocity + at.impact_speed)))],
    ),
    of(
        "force-stale",
        "the force that depends on V is that of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| at_velocity(at, at.entry_speed))],
    ),
    of(
        "force-stale",
        "the force is that of the mean of V and that of the start of the stage",
        Parameter::None,
        &[Change::Force(|at, _| at_velocity(at, 0.5 * (at.velocity + at.entry_speed)))],
    ),
    of(
        "force-stale",
        "the spring gives the force of the start of the stage throughout",
        Parameter::None,
        &[Change::Problem(|p, _| spring_at(p, 0.0, |_| true))],
    ),
    of(
        "force-stale",
        "the spring gives the force of the middle of the stage throughout",
        Parameter::None,
        &[Change::Problem(|p, _| spring_at(p, 0.5, |_| true))],
    ),
    of(
        "force-stale",
        "the spring gives the force of the end of the stage throughout",
        Parameter::None,
        &[Change::Problem(|p, _| spring_at(p, 1.0, |_| true))],
    ),
    of(
        "viscosity-power",
        "the viscous force is r V0 (V/V0)^{}, not r V",
        Parameter::Exponent(1.0),
        &[Change::Force(|at, n| with_viscosity(at, at.impact_speed * (at.velocity.abs() / at.impact_speed).powf(n)))],
    ),
    of(
        "force-clipped",
        "the drag is q V min(V, {} m/s)",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| with_drag(at, at.velocity * at.velocity.min(n)))],
    ),
    of(
        "force-clipped",
        "the drag is q V max(V, {} m/s)",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| with_drag(at, at.velocity * at.velocity.max(n)))],
    ),
    of(
        "force-clipped",
        "the drag is that of at most {} m/s",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| with_drag(at, at.velocity.min(n).powi(2)))],
    ),
    of(
        "force-clipped",
        "the drag is that of at least {} m/s",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| with_drag(at, at.velocity.max(n).powi(2)))],
    ),
    of(
        "force-clipped",
        "the viscous force is that of at most {} m/s",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| with_viscosity(at, at.velocity.min(n)))],
    ),
    of(
        "force-clipped",
        "the viscous force is that of at least {} m/s",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| with_viscosity(at, at.velocity.max(n)))],
    ),
    of(
        "force-clipped",
        "the force is that of at most {} m/s",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| at_velocity(at, at.velocity.min(n)))],
    ),
    of(
        "force-clipped",
        "the force is that of at least {} m/s",
        Parameter::Value(10.0),
        &[Change::Force(|at, n| at_velocity(at, at.velocity.max(n)))],
    ),
    of(
        "force-clipped",
        "the force is at least {} N",
        Parameter::Value(1e3),
        &[Change::Force(|at, n| right_force(at, n).max(n))],
    ),
    of(
        "force-clipped",
        "V never exceeds V0: a drive then counts as zero",
        Parameter::None,
        &[Change::Force(
            |at, n| if at.velocity < at.impact_speed { right_force(at, n) } else { right_force(at, n).max(0.0) },
        )],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the end of the first stage, in every other",
        Parameter::None,
        &[Change::Problem(|p, _| {
            let origin = p.stages[0].end;
            for law in p.stages.iter_mut().skip(1) {
                law.static_force -= law.stiffness * origin;
            }
        })],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the end of the stage, unless it has none",
        Parameter::None,
        &[Change::Problem(|p, _| {
            for law in p.stages.iter_mut().filter(|law| law.end.is_finite()) {
                law.static_force -= law.stiffness * law.end;
            }
        })],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the start of the stage where it comes to rest in one of stiffness and static force",
        Parameter::None,
        &[Change::OfRight(|p, right, _| {
            let stage = p.stages.iter().position(|law| right.depth < law.end).unwrap_or(0);
            let start = p.start_of(stage);
            let law = &mut p.stages[stage];
            if right.velocity <= 0.0 && law.viscosity == 0.0 && law.drag == 0.0 {
                law.static_force -= law.stiffness * start;
            }
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "the stiffness of a first stage without other forces is not the one given: it continues the force of the second",
        Parameter::None,
        &[Change::Problem(|p, _| {
            if let [crater, tunnel, ..] = p.stages[..]
                && Stage::crater(crater.stiffness, crater.end) == crater
                && tunnel.static_force > 0.0
            {
                let (p0, q, depth) = (tunnel.static_force, tunnel.drag, crater.end);
                let force = p0 + q * p.impact_speed * p.impact_speed;
                p.stages[0].stiffness = p.mass * force / (depth * (p.mass + depth * q));
            }
        })],
    ),
    of(
        "term:velocity",
        "the force is that of {} times V: drag and viscosity are both wrong",
        Parameter::Factor,
        &[Change::Problem(|p, f| {
            for law in &mut p.stages {
                law.viscosity *= f;
                law.drag *= f * f;
            }
        })],
    ),
    of(
        "force-smoothed",
        "behind each end of a stage the force goes over from that of the stage before within {} m",
        Parameter::Value(1e-3),
        &[Change::Force(|at, n| blended(at, 0.0, n))],
    ),
    of(
        "force-smoothed",
        "the jump of the force at each end of a stage is spread over {} m before and behind it",
        Parameter::Value(1e-3),
        &[Change::Force(|at, n| blended(at, -n, n))],
    ),
    of(
        "force-smoothed",
        "before each end of a stage the force goes over to that of the next stage within {} m",
        Parameter::Value(1e-3),
        &[Change::Force(|at, n| blended(at, -n, 0.0))],
    ),
    of(
        "term:static-force",
        "the static force p is left out below {} V0",
        Parameter::Fraction,
        &[Change::Force(|at, n| without_term::<STATIC_FORCE, true>(at, n * at.impact_speed))],
    ),
    of(
        "term:viscosity",
        "the viscosity r is left out below {} V0",
        Parameter::Fraction,
        &[Change::Force(|at, n| without_term::<VISCOSITY, true>(at, n * at.impact_speed))],
    ),
    of(
        "term:viscosity",
        "the viscosity r is left out above {} m/s",
        Parameter::Speed,
        &[Change::Force(without_term::<VISCOSITY, false>)],
    ),
    of(
        "term:viscosity",
        "the viscosity r is left out above {} V0",
        Parameter::Fraction,
        &[Change::Force(|at, n| without_term::<VISCOSITY, false>(at, n * at.impact_speed))],
    ),
    of(
        "term:drag",
        "the drag q is left out below {} V0",
        Parameter::Fraction,
        &[Change::Force(|at, n| without_term::<DRAG, true>(at, n * at.impact_speed))],
    ),
    of(
        "term:drag",
        "the drag q is left out above {} m/s",
        Parameter::Speed,
        &[Change::Force(without_term::<DRAG, false>)],
    ),
    of(
        "term:drag",
        "the drag q is left out above {} V0",
        Parameter::Fraction,
        &[Change::Force(|at, n| without_term::<DRAG, false>(at, n * at.impact_speed))],
    ),
    of(
        "input-rounded",
        "the coefficients of the force are rounded to single precision",
        Parameter::None,
        &[Change::Problem(|p, _| single_coefficients(p))],
    ),
    of(
        "input-rounded",
        "the mass and the coefficients of the force are rounded to single precision",
        Parameter::None,
        &[Change::Problem(|p, _| {
            p.mass = to_single(p.mass);
            single_coefficients(p);
        })],
    ),
    of(
        "term:softening",
        "a stiffness below zero is {} times the right one",
        Parameter::Factor,
        &[Change::Problem(scale_term::<SOFTENING, ALL>)],
    ),
    of(
        "term:drive",
        "a static force that drives (p < 0) is {} times the right one",
        Parameter::Factor,
        &[Change::Problem(scale_term::<DRIVE, ALL>)],
    ),
    of(
        "term:drive",
        "a static force that drives (p < 0) is {} times the right one in every stage but the first",
        Parameter::Factor,
        &[Change::Problem(scale_term::<DRIVE, LATER>)],
    ),
];

/// Keeps what `keep` takes from the question `before`, if nothing else differs from it.
fn keep_alone(problem: &mut Problem, before: &Problem, keep: impl Fn(&mut Problem, &Problem)) {
    let mut kept = problem.clone();
    keep(&mut kept, before);
    let is_before = kept.mass == before.mass
        && kept.impact_speed == before.impact_speed
        && kept.exit_depth == before.exit_depth
        && kept.stages == before.stages;
    if is_before {
        *problem = kept;
    }
}

/// Inputs kept from an earlier question: looked at last, for a question may have none of them.
pub(super) static EARLIER: &[Hypothesis] = &[
    of(
        "input-kept",
        "the mass is that of the first question",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.mass = earlier.first.mass)],
    ),
    of(
        "input-kept",
        "the impact speed is that of the first question",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.impact_speed = earlier.first.impact_speed)],
    ),
    of(
        "input-kept",
        "the exit depth is that of the first question",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.exit_depth = earlier.first.exit_depth)],
    ),
    of(
        "input-kept",
        "the stages are those of the first question",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.stages.clone_from(&earlier.first.stages))],
    ),
    of(
        "input-kept",
        "the mass is that of the question before",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.mass = earlier.previous.mass)],
    ),
    of(
        "input-kept",
        "the impact speed is that of the question before",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.impact_speed = earlier.previous.impact_speed)],
    ),
    of(
        "input-kept",
        "the exit depth is that of the question before",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.exit_depth = earlier.previous.exit_depth)],
    ),
    of(
        "input-kept",
        "the stages are those of the question before",
        Parameter::None,
        &[Change::Kept(|p, earlier| p.stages.clone_from(&earlier.previous.stages))],
    ),
    of(
        "input-kept",
        "the continuous crater stiffness is that of the question before, on the same target",
        Parameter::None,
        &[Change::Kept(|p, earlier| {
            let before = &earlier.previous;
            if p.crater == Some(0)
                && before.crater == Some(0)
                && p.stages[1..] == before.stages[1..]
                && p.stages[0].end == before.stages[0].end
            {
                p.stages[0] = before.stages[0];
            }
        })],
    ),
    of(
        "input-kept",
        "where the mass alone differs from the question before, the answer is the one given there",
        Parameter::None,
        &[Change::Kept(|p, earlier| keep_alone(p, &earlier.previous, |p, before| p.mass = before.mass))],
    ),
    of(
        "input-kept",
        "where the impact speed alone differs from the question before, the answer is the one given there",
        Parameter::None,
        &[Change::Kept(|p, earlier| {
            keep_alone(p, &earlier.previous, |p, before| p.impact_speed = before.impact_speed);
        })],
    ),
    of(
        "input-kept",
        "where the stages alone differ from the question before, the answer is the one given there",
        Parameter::None,
        &[Change::Kept(|p, earlier| {
            keep_alone(p, &earlier.previous, |p, before| p.stages.clone_from(&before.stages));
        })],
    ),
    of(
        "input-kept",
        "where no exit is asked for, the last one that was holds",
        Parameter::None,
        &[Change::Kept(|p, earlier| {
            if !p.has_exit() {
                p.exit_depth = earlier.exit;
            }
        })],
    ),
];
