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

/// Part of the way through a stage that is one step at most: over all of it the other force would act throughout, which is another fault.
const OF_STAGE: f64 = 0.9;

/// The last part of the flight, of a `length` (m), with a term of the stage in front of the last one reached, or behind it.
fn in_last_step<const TERM: u8, const BEHIND: bool>(problem: &mut Problem, right: &State, length: f64) {
    let Some(stage) = problem.stages.iter().position(|law| right.depth <= law.end) else { return };
    let beside = if BEHIND { stage + 1 } else { stage.wrapping_sub(1) };
    if let Some(other) = problem.stages.get(beside).copied()
        && length <= OF_STAGE * (right.depth - problem.start_of(stage))
    {
        let law = problem.stages[stage];
        problem.stages[stage].end = right.depth - length;
        problem.stages.insert(stage + 1, with_term_of(law, other, TERM, law.end));
    }
}

/// The first part of the last stage reached, of a `length` (m), with a term of the stage in front of it.
fn in_first_step<const TERM: u8>(problem: &mut Problem, right: &State, length: f64) {
    let Some(stage) = problem.stages.iter().position(|law| right.depth <= law.end).filter(|stage| *stage > 0) else {
        return;
    };
    let (law, start) = (problem.stages[stage], problem.start_of(stage));
    if length <= OF_STAGE * (right.depth - start) {
        problem.stages.insert(stage, with_term_of(law, problem.stages[stage - 1], TERM, start + length));
    }
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
