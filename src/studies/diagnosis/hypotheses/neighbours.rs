//! The force of a stage beside the right one, in one step: that which ends at an event, or the first one of a stage.
//!
//! How long that step is nobody says: each answer has a length of its own, and flights through one end of a stage show it.

use super::force::{DRAG, STATIC_FORCE, STIFFNESS, VISCOSITY, term_of};
use super::{Change, Hypothesis, Parameter, of};
use crate::physics::{Problem, Stage, State};

/// The whole force of the other stage.
const EVERY: u8 = u8::MAX;

/// `law` with a term of `other`, or with all of them, until `end`.
fn with_term_of(mut law: Stage, mut other: Stage, term: u8, end: f64) -> Stage {
    if term == EVERY {
        return Stage { end, ..other };
    }
    *term_of(&mut law, term) = *term_of(&mut other, term);
    Stage { end, ..law }
}

/// The last part of the flight, of a `length` (m), with a term of the stage in front of the last one reached, or behind it.
fn in_last_step<const TERM: u8, const BEHIND: bool>(problem: &mut Problem, right: &State, length: f64) {
    let Some(stage) = problem.stages.iter().position(|law| right.depth <= law.end) else { return };
    let beside = if BEHIND { stage + 1 } else { stage.wrapping_sub(1) };
    if let Some(other) = problem.stages.get(beside).copied() {
        let law = problem.stages[stage];
        problem.stages[stage].end = (right.depth - length).max(problem.start_of(stage));
        problem.stages.insert(stage + 1, with_term_of(law, other, TERM, law.end));
    }
}

/// The first part of the last stage reached, of a `length` (m), with a term of the stage in front of it.
fn in_first_step<const TERM: u8>(problem: &mut Problem, right: &State, length: f64) {
    let Some(stage) = problem.stages.iter().position(|law| right.depth <= law.end).filter(|stage| *stage > 0) else {
        return;
    };
    let law = problem.stages[stage];
    let to = (problem.start_of(stage) + length).min(law.end);
    problem.stages.insert(stage, with_term_of(law, problem.stages[stage - 1], TERM, to));
}

macro_rules! beside {
    ($what:literal, $term:ident, $first:literal) => {
        [
            of(
                "force-stale",
                concat!("in the step that ends at an event ", $what, " is that of the stage in front of it"),
                Parameter::Overshoot,
                &[Change::OfRight(in_last_step::<$term, false>)],
            ),
            of(
                "force-stale",
                concat!("in the step that ends at an event ", $what, " is that of the stage behind it"),
                Parameter::Overshoot,
                &[Change::OfRight(in_last_step::<$term, true>)],
            ),
            of(
                $first,
                concat!("in the first step of a stage ", $what, " is that of the stage in front of it"),
                Parameter::Overshoot,
                &[Change::OfRight(in_first_step::<$term>)],
            ),
        ]
    };
}

/// A force, or one term of it, of a stage beside the right one.
pub(super) static FAULTS: [[Hypothesis; 3]; 5] = [
    // As if the end of that stage were taken late.
    beside!("the force", EVERY, "stage-end-late"),
    beside!("the static force p", STATIC_FORCE, "force-stale"),
    beside!("the stiffness s", STIFFNESS, "force-stale"),
    beside!("the viscosity r", VISCOSITY, "force-stale"),
    beside!("the drag q", DRAG, "force-stale"),
];
