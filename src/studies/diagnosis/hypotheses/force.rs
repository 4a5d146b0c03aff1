//! Faults of the force: its terms, which stage they are of, and what is added or left out.

use super::super::simulation::{Place, right_force};
use super::{Change, DIGITS, GRAINS, Hypothesis, Parameter, of, to_digits, to_grain};
use crate::physics::{Problem, Stage};

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
        if is_meant && (TERM != DRIVE || law.static_force < 0.0) {
            *term_of(law, TERM) *= factor;
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

fn term_of(law: &mut Stage, term: u8) -> &mut f64 {
    match term {
        STIFFNESS => &mut law.stiffness,
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
            _ => kept,
        };
    }
}

fn borrow_term<const TERM: u8, const FROM: u8>(problem: &mut Problem, _: f64) {
    borrow(problem, TERM, FROM);
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

/// Standard gravity (m/s²).
const GRAVITY: f64 = 9.80665;

fn add_force(problem: &mut Problem, force: f64) {
    problem.stages.iter_mut().for_each(|law| law.static_force += force);
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
                concat!($what, " is the mean of this stage's and that of the stage before"),
                Parameter::None,
                &[Change::Problem(borrow_term::<$term, MEAN>)],
            ),
        ]
    };
}

/// Faults of single terms.
pub(super) static TERMS: [[Hypothesis; 9]; 4] = [
    term!("term:static-force", "the static force p", STATIC_FORCE),
    term!("term:stiffness", "the stiffness s", STIFFNESS),
    term!("term:viscosity", "the viscosity r", VISCOSITY),
    term!("term:drag", "the drag q", DRAG),
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
        Parameter::Value,
        &[Change::Force(|at, n| right_force(at, n) + n * at.mass * at.velocity)],
    ),
    of(
        "extra-force",
        "a force of {} kg/s times V is added to the resistance",
        Parameter::Value,
        &[Change::Force(|at, n| right_force(at, n) + n * at.velocity)],
    ),
    of(
        "extra-force",
        "a force of {} kg/m times V² is added to the resistance",
        Parameter::Value,
        &[Change::Force(|at, n| right_force(at, n) + n * at.velocity * at.velocity)],
    ),
    of(
        "extra-force",
        "a force of {} N/m times x is added to the resistance",
        Parameter::Value,
        &[Change::Force(|at, n| right_force(at, n) + n * at.depth)],
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
        Parameter::Value,
        &[Change::Force(|at, n| right_force(at, n).min(n))],
    ),
    of(
        "force-clipped",
        "the deceleration is at most {} m/s²",
        Parameter::Value,
        &[Change::Force(|at, n| right_force(at, n).min(n * at.mass))],
    ),
    of(
        "term:drag",
        "the drag q is left out below {} m/s",
        Parameter::Speed,
        &[Change::Force(|at, n| with_drag(at, if at.velocity < n { 0.0 } else { at.velocity * at.velocity }))],
    ),
    of(
        "term:drag",
        "the drag q is left out above {} m/s",
        Parameter::Speed,
        &[Change::Force(|at, n| with_drag(at, if at.velocity > n { 0.0 } else { at.velocity * at.velocity }))],
    ),
    of(
        "term:viscosity",
        "the viscosity r is left out below {} m/s",
        Parameter::Speed,
        &[Change::Force(|at, n| with_viscosity(at, if at.velocity < n { 0.0 } else { at.velocity }))],
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
