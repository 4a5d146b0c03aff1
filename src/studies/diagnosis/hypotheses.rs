//! What can be wrong with a solver: one small change of the problem, of the force or of the answer each.
//!
//! A hypothesis says what a solver with its fault would answer; [`super::causes`] asks which of them explains the answers
//! that came. The next one is one more entry of [`HYPOTHESES`].

use super::questions::Question;
use super::simulation::{Force, Place, Simulated, continued, right_force, simulate, solve};
use crate::physics::{Concrete, CraterStiffness, Problem, Resistance, Scene, Stage, State};
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
    /// An exponent, the same in every answer.
    Exponent,
    /// A speed (m/s), the same in every answer.
    Speed,
    /// Part of the impact speed, the same in every answer.
    Fraction,
    /// A distance (m), another one in every answer.
    Delay,
    /// A time (s), another one in every answer.
    Lateness,
    /// One of a few numbers, the same in every answer.
    OneOf(&'static [f64]),
    /// A value in place of that of the question, the same in every answer.
    Value,
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
    /// The problem.
    Problem(fn(&mut Problem, f64)),
    /// The force.
    Force(Force),
    /// The speed (m/s) that counts as rest.
    RestSpeed(fn(&Problem, f64) -> f64),
    /// What is reported of a flight through the problem.
    Report(fn(&Problem, &mut Simulated, f64)),
}

impl Parameter {
    /// Whether each answer has a number of its own.
    pub(super) fn is_per_answer(self) -> bool {
        matches!(self, Self::Delay | Self::Lateness | Self::Nearness | Self::Choice(_))
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
            Self::OneOf(numbers) => numbers.to_vec(),
            Self::Value => spread(1e-3, 1e5, 64).collect(),
            Self::Exponent => (0..=24).map(|i| 0.25 * f64::from(i)).collect(),
            Self::Speed => spread(1e-9, 1e3, 72).collect(),
            Self::Fraction => spread(1e-12, 0.9, 60).collect(),
            Self::Delay => spread(1e-10, 10.0, 44).map(|part| part * question.exact.end.depth).collect(),
            Self::Lateness => spread(1e-10, 10.0, 44).map(|part| part * question.exact.end.time).collect(),
            Self::Nearness => {
                let off: Vec<f64> = spread(1e-8, 0.5, 32).collect();
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
    if changes().any(|(change, _)| matches!(change, Change::Scene(_))) {
        let mut scene = question.scene.clone()?;
        for (change, number) in changes() {
            if let Change::Scene(alter) = change {
                alter(&mut scene, number);
            }
        }
        problem = scene.problem().ok()?;
    }
    for (change, number) in changes() {
        if let Change::Problem(alter) = change {
            alter(&mut problem, number);
        }
    }
    let is_ordered = problem.stages.windows(2).all(|pair| pair[0].end <= pair[1].end);
    let is_closed = problem.stages.last().is_some_and(|last| last.end == f64::INFINITY);
    if !(is_ordered
        && is_closed
        && problem.stages[0].end > 0.0
        && problem.mass > 0.0
        && problem.impact_speed > 0.0
        && problem.exit_depth > 0.0)
    {
        return None;
    }
    let mut force: Option<(Force, f64)> = None;
    let mut rest_speed = None;
    for (change, number) in changes() {
        match change {
            // Two laws cannot both be the law.
            Change::Force(_) if force.is_some() => return None,
            Change::Force(law) => force = Some((*law, number)),
            Change::RestSpeed(of) => rest_speed = Some(of(&problem, number)),
            _ => {}
        }
    }
    let mut found = match (how, force, rest_speed) {
        (How::Exact, None, None) => solve(&problem)?,
        (How::Exact, force, rest_speed) => {
            let (law, number) = force.unwrap_or((right_force, 1.0));
            simulate(&problem, law, number, rest_speed.unwrap_or(0.0))?
        }
        (How::Scheme(scheme, step), None, None) => {
            let end = scheme.end(&problem, step)?;
            let stage = problem.stages.iter().position(|law| end.depth < law.end)?;
            Simulated { end, stage, passed: Vec::new() }
        }
        (How::Scheme(..), ..) => return None,
    };
    for (change, number) in changes() {
        if let Change::Report(alter) = change {
            alter(&problem, &mut found, number);
        }
    }
    found.end.is_finite().then_some((problem, found))
}

/// Stages that a fault concerns: all, the first, all but the first, the last.
const ALL: u8 = 0;
const FIRST: u8 = 1;
const LATER: u8 = 2;
const LAST: u8 = 3;

/// Terms of the force; a drive is a static force below zero.
const STATIC_FORCE: u8 = 0;
const STIFFNESS: u8 = 1;
const VISCOSITY: u8 = 2;
const DRAG: u8 = 3;
const DRIVE: u8 = 4;

/// The `TERM` of the force times `factor` in a `PART` of the stages.
fn scale_term<const TERM: u8, const PART: u8>(problem: &mut Problem, factor: f64) {
    let count = problem.stages.len();
    for (index, law) in problem.stages.iter_mut().enumerate() {
        let is_meant = match PART {
            FIRST => index == 0,
            LATER => index > 0,
            LAST => index + 1 == count,
            _ => true,
        };
        let is_drive = law.static_force < 0.0;
        let term = match TERM {
            STIFFNESS => &mut law.stiffness,
            VISCOSITY => &mut law.viscosity,
            DRAG => &mut law.drag,
            DRIVE if !is_drive => continue,
            _ => &mut law.static_force,
        };
        if is_meant {
            *term *= factor;
        }
    }
}

/// The laws of all stages, their ends left where they are, replaced by `law` of the index and the count.
fn reorder(problem: &mut Problem, law: impl Fn(usize, usize) -> usize) {
    let laws = problem.stages.clone();
    for (index, stage) in problem.stages.iter_mut().enumerate() {
        *stage = laws[law(index, laws.len()).min(laws.len() - 1)].until(stage.end);
    }
}

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

fn concrete(scene: &mut Scene, alter: impl FnOnce(&mut Concrete)) {
    if let Resistance::Concrete(concrete) = &mut scene.resistance {
        alter(concrete);
    }
}

/// The tunnel of a scene, its impact speed and its mass.
fn set_crater(scene: &mut Scene, stiffness: impl FnOnce(&Stage, f64, f64, f64) -> f64) {
    let Ok(problem) = scene.problem() else { return };
    let (depth, tunnel) = problem.crater_depth_and_tunnel();
    concrete(scene, |concrete| {
        if concrete.crater_stiffness == CraterStiffness::Continuous && depth > 0.0 {
            let stiffness = stiffness(&tunnel, depth, problem.impact_speed, problem.mass);
            concrete.crater_stiffness = CraterStiffness::Given(stiffness);
        }
    });
}

fn exit_at_start_of_last(problem: &mut Problem) {
    let start = problem.start_of(problem.stages.len() - 1);
    problem.exit_depth = problem.exit_depth.max(start);
}

/// `number` to so many significant digits.
fn to_digits(number: f64, digits: f64) -> f64 {
    format!("{number:.*e}", digits as usize - 1).parse().unwrap_or(number)
}

/// Numbers of digits that an input may be rounded to, and units that it may be rounded or cut to.
const DIGITS: &[f64] = &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
const GRAINS: &[f64] = &[1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e6];
/// The same of strengths (Pa).
const STRENGTHS: &[f64] = &[1e3, 1e4, 1e5, 1e6, 1e7];

fn to_grain(number: f64, grain: f64) -> f64 {
    (number / grain).round() * grain
}

/// Standard gravity (m/s²).
const GRAVITY: f64 = 9.80665;

fn add_force(problem: &mut Problem, force: f64) {
    problem.stages.iter_mut().for_each(|law| law.static_force += force);
}

fn shift_time(found: &mut Simulated, by: f64) {
    found.end.time += by;
}

const RIGHT: f64 = 1.0;

const fn of(id: &'static str, statement: &'static str, parameter: Parameter, changes: &'static [Change]) -> Hypothesis {
    Hypothesis { id, statement, parameter, changes }
}

/// A term of the force, in all stages and in a part of them.
macro_rules! term {
    ($id:literal, $what:literal, $term:ident) => {
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
                concat!($what, " is {} times the right one in the last stage alone"),
                Parameter::Factor,
                &[Change::Problem(scale_term::<$term, LAST>)],
            ),
        ]
    };
}

/// Faults of single terms.
static TERMS: [[Hypothesis; 4]; 5] = [
    term!("term:static-force", "the static force p", STATIC_FORCE),
    term!("term:stiffness", "the stiffness s", STIFFNESS),
    term!("term:viscosity", "the viscosity r", VISCOSITY),
    term!("term:drag", "the drag q", DRAG),
    term!("term:drive", "a static force that drives (p < 0)", DRIVE),
];

/// Every other fault.
static OTHERS: &[Hypothesis] = &[
    of("outcome-name", "the numbers are right, and the outcome named is not", Parameter::None, &[]),
    of("term:mass", "the mass is {} times the right one", Parameter::Factor, &[Change::Problem(|p, f| p.mass *= f)]),
    of(
        "impact-speed",
        "the impact speed is {} times the right one",
        Parameter::Factor,
        &[Change::Problem(|p, f| p.impact_speed *= f)],
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
        &[Change::Problem(|p, f| add_force(p, f * p.mass * GRAVITY))],
    ),
    of(
        "extra-force",
        "a constant force of {} N is added to the resistance",
        Parameter::Unit,
        &[Change::Problem(add_force)],
    ),
    of(
        "input-rounded",
        "the mass is rounded to {} digits",
        Parameter::OneOf(DIGITS),
        &[Change::Problem(|p, digits| p.mass = to_digits(p.mass, digits))],
    ),
    of(
        "input-rounded",
        "the impact speed is rounded to {} digits",
        Parameter::OneOf(DIGITS),
        &[Change::Problem(|p, digits| p.impact_speed = to_digits(p.impact_speed, digits))],
    ),
    of(
        "input-rounded",
        "the impact speed is rounded to a multiple of {} m/s",
        Parameter::OneOf(GRAINS),
        &[Change::Problem(|p, grain| p.impact_speed = to_grain(p.impact_speed, grain))],
    ),
    of(
        "input-rounded",
        "the impact speed is cut to a multiple of {} m/s",
        Parameter::OneOf(GRAINS),
        &[Change::Problem(|p, grain| p.impact_speed = (p.impact_speed / grain).floor() * grain)],
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
        "the exit depth is rounded to a multiple of {} m",
        Parameter::OneOf(GRAINS),
        &[Change::Problem(|p, grain| {
            if p.has_exit() {
                p.exit_depth = to_grain(p.exit_depth, grain);
            }
        })],
    ),
    of(
        "input-rounded",
        "the density is rounded to a multiple of {} kg/m³",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| concrete(s, |c| c.density = to_grain(c.density, grain)))],
    ),
    of(
        "input-rounded",
        "the strength is rounded to a multiple of {} Pa",
        Parameter::OneOf(STRENGTHS),
        &[Change::Scene(|s, grain| {
            concrete(s, |c| {
                let rounded = to_grain(c.strength, grain);
                if c.follows_eq14 {
                    c.static_factor = crate::physics::semi_empirical::static_factor(rounded);
                }
                c.strength = rounded;
            });
        })],
    ),
    of(
        "input-rounded",
        "the diameter is rounded to a multiple of {} m",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| concrete(s, |c| c.diameter = to_grain(c.diameter, grain)))],
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
        Parameter::Exponent,
        &[Change::Force(|at, n| {
            let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
            static_force + stiffness * at.depth + viscosity * at.velocity + drag * at.velocity.abs().powf(n)
        })],
    ),
    of(
        "drag-power",
        "the drag is q V0² (V/V0)^{}, not q V²",
        Parameter::Exponent,
        &[Change::Force(|at, n| {
            let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
            let relative = at.velocity.abs() / at.impact_speed;
            static_force
                + stiffness * at.depth
                + viscosity * at.velocity
                + drag * at.impact_speed * at.impact_speed * relative.powf(n)
        })],
    ),
    of(
        "viscosity-power",
        "the viscosity r is multiplied by V^{}, not by V",
        Parameter::Exponent,
        &[Change::Force(|at, n| {
            let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
            static_force
                + stiffness * at.depth
                + viscosity * at.velocity.abs().powf(n)
                + drag * at.velocity * at.velocity
        })],
    ),
    of(
        "stiffness-power",
        "the stiffness s is multiplied by x^{}, not by x",
        Parameter::Exponent,
        &[Change::Force(|at, n| {
            let &Stage { static_force, stiffness, viscosity, drag, .. } = at.law;
            static_force + stiffness * at.depth.abs().powf(n) + (viscosity + drag * at.velocity) * at.velocity
        })],
    ),
    of(
        "force-stale",
        "the force that depends on V is that of the impact speed throughout",
        Parameter::None,
        &[Change::Force(|at, _| right_force(&Place { velocity: at.impact_speed, ..*at }, RIGHT))],
    ),
    of(
        "drag-on-viscosity",
        "the drag is left out where there is viscosity",
        Parameter::None,
        &[Change::Problem(|p, _| {
            p.stages.iter_mut().filter(|law| law.viscosity > 0.0).for_each(|law| law.drag = 0.0);
        })],
    ),
    of(
        "drag-on-viscosity",
        "the viscosity is left out where there is drag",
        Parameter::None,
        &[Change::Problem(|p, _| {
            p.stages.iter_mut().filter(|law| law.drag > 0.0).for_each(|law| law.viscosity = 0.0);
        })],
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
        "parameter:diameter",
        "the diameter is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| concrete(s, |c| c.diameter *= f))],
    ),
    of(
        "parameter:area",
        "the area pi d²/4 is {} times the right one (4 is pi d²)",
        Parameter::Factor,
        &[Change::Scene(scale_area)],
    ),
    of(
        "parameter:density",
        "density, nose factor or B, which act as one product, is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| concrete(s, |c| c.density *= f))],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor is left out: N* = 1",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.nose_factor = 1.0))],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor enters as N*^{}",
        Parameter::Exponent,
        &[Change::Scene(|s, n| {
            concrete(s, |c| {
                c.density *= c.nose_factor.powf(n - 1.0);
            });
        })],
    ),
    of(
        "parameter:B",
        "B is left out: B = 1",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.inertia_factor = 1.0))],
    ),
    of(
        "parameter:B",
        "B enters as B^{}",
        Parameter::Exponent,
        &[Change::Scene(|s, n| concrete(s, |c| c.inertia_factor = c.inertia_factor.powf(n)))],
    ),
    of(
        "parameter:strength",
        "the strength is {} times the right one, in Eq. 14 too",
        Parameter::Factor,
        &[Change::Scene(|s, f| {
            concrete(s, |c| {
                c.strength *= f;
                if c.follows_eq14 {
                    c.static_factor /= f.abs().sqrt();
                }
            });
        })],
    ),
    of(
        "parameter:S",
        "S, or the strength it multiplies, is {} times the right one",
        Parameter::Unit,
        &[Change::Scene(|s, f| scale_static_factor(s, f, |_| true))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is {} times the right one; 0.001 is a strength in Pa",
        Parameter::Unit,
        &[Change::Scene(|s, f| scale_static_factor(s, f, |c| c.follows_eq14))],
    ),
    of(
        "parameter:S",
        "S is {} times the right one where it is stated",
        Parameter::Unit,
        &[Change::Scene(|s, f| scale_static_factor(s, f, |c| !c.follows_eq14))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 holds (fc/MPa)^{}, not ^-0.5",
        Parameter::Exponent,
        &[Change::Scene(|s, n| {
            concrete(s, |c| {
                if c.follows_eq14 {
                    c.static_factor *= (1e-6 * c.strength).powf(0.5 - n);
                }
            });
        })],
    ),
    of(
        "parameter:S",
        "a stated S is ignored: Eq. 14 is used",
        Parameter::None,
        &[Change::Scene(|s, _| {
            concrete(s, |c| {
                c.static_factor = crate::physics::semi_empirical::static_factor(c.strength);
            });
        })],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is that of another formula: 82.6 (fc/MPa)^-0.544",
        Parameter::None,
        &[Change::Scene(|s, _| {
            concrete(s, |c| {
                if c.follows_eq14 {
                    c.static_factor = 82.6 * (1e-6 * c.strength).powf(-0.544);
                }
            });
        })],
    ),
    of(
        "parameter:S",
        "S is always {}",
        Parameter::Value,
        &[Change::Scene(|s, value| concrete(s, |c| c.static_factor = value))],
    ),
    of(
        "parameter:density",
        "the density is always {} kg/m³",
        Parameter::Value,
        &[Change::Scene(|s, value| concrete(s, |c| c.density = value))],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor is always {}",
        Parameter::Value,
        &[Change::Scene(|s, value| concrete(s, |c| c.nose_factor = value))],
    ),
    of(
        "parameter:k",
        "k is always {}",
        Parameter::Value,
        &[Change::Scene(|s, value| concrete(s, |c| c.crater_ratio = value))],
    ),
    of(
        "parameter:k",
        "k is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| concrete(s, |c| c.crater_ratio *= f))],
    ),
    of(
        "parameter:crater-stiffness",
        "the crater stiffness c is {} times the right one",
        Parameter::Factor,
        &[Change::Problem(|p, f| {
            if let Some(crater) = p.crater {
                p.stages[crater].stiffness *= f;
            }
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "a stated crater stiffness is ignored: the continuous one is used",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.crater_stiffness = CraterStiffness::Continuous))],
    ),
    of(
        "parameter:crater-stiffness",
        "c is continued with the impact speed: c = (P + Q V0²)/(k d)",
        Parameter::None,
        &[Change::Scene(|s, _| {
            set_crater(s, |tunnel, depth, speed, _| (tunnel.static_force + tunnel.drag * speed * speed) / depth);
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "c is P/(k d) where the continuous one means rest in the crater",
        Parameter::None,
        &[Change::Scene(|s, _| {
            set_crater(s, |tunnel, depth, speed, mass| {
                let right = Stage::continuous_crater(depth, tunnel, mass, speed).stiffness;
                if right * depth >= tunnel.static_force { right } else { tunnel.static_force / depth }
            });
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "c is that without drag: c = P/(k d)",
        Parameter::None,
        &[Change::Scene(|s, _| set_crater(s, |tunnel, depth, _, _| tunnel.static_force / depth))],
    ),
];

/// Every hypothesis.
pub(super) fn hypotheses() -> impl Iterator<Item = &'static Hypothesis> {
    TERMS.iter().flatten().chain(OTHERS)
}

impl Hypothesis {
    /// Whether it is about a solver that reads the scene.
    pub(super) fn needs_scene(&self) -> bool {
        self.changes.iter().any(|change| matches!(change, Change::Scene(_)))
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

/// The last end of a stage before the stage of the end.
fn last_end(found: &Simulated) -> Option<State> {
    found.passed.iter().rev().find(|(index, _)| *index < found.stage).map(|(_, state)| *state)
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

fn scale_area(scene: &mut Scene, factor: f64) {
    concrete(scene, |concrete| {
        concrete.density *= factor;
        concrete.static_factor *= factor;
    });
}

fn scale_static_factor(scene: &mut Scene, factor: f64, is_meant: impl Fn(&Concrete) -> bool) {
    concrete(scene, |concrete| {
        if is_meant(concrete) {
            concrete.static_factor *= factor;
        }
    });
}
