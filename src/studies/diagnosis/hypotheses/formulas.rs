//! Faults of closed forms: of the formula for one kind of stage.
//!
//! A stage of stiffness and viscosity, with a static force or without, is left by
//!
//! ```text
//! x = -p/s + e^(-g t) (A cos w t + B sin w t),    g = r/2M,    w² = s/M - g²,
//! ```
//!
//! with cosh and sinh where w² < 0, which is where r² > 4 s M. Whatever g and w² a solver takes there, with A and B by the state
//! at the start of the stage, its flight is that of a stage with r = 2 M g, s = M (g² + w²) and the same p/s.

use super::super::questions::Question;
use super::force::{DRAG, STATIC_FORCE, STIFFNESS, VISCOSITY, spring_at, term_of};
use super::{Change, Hypothesis, Parameter, of};
use crate::physics::{Problem, Stage};

/// Kinds of stages that have a formula: by the terms beside a static force, which may be none.
const STEADY: u8 = 0;
const SPRING: u8 = 1;
const VISCOUS: u8 = 2;
const DRAGGED: u8 = 3;
const DAMPED: u8 = 4;
const BRAKED_SPRING: u8 = 5;

fn is_of_kind(law: &Stage, kind: u8) -> bool {
    let terms = [law.stiffness, law.viscosity, law.drag].map(|term| term != 0.0);
    terms
        == match kind {
            STEADY => [false, false, false],
            SPRING => [true, false, false],
            VISCOUS => [false, true, false],
            DRAGGED => [false, false, true],
            DAMPED => [true, true, false],
            _ => [true, false, true],
        }
}

/// The `TERM` of the force times `factor` in stages of a `KIND`.
fn scale_in<const TERM: u8, const KIND: u8>(problem: &mut Problem, factor: f64) {
    for law in problem.stages.iter_mut().filter(|law| is_of_kind(law, KIND)) {
        *term_of(law, TERM) *= factor;
    }
}

/// The depth in s x counted from the start of the stage, in stages of a `KIND`.
fn from_the_start<const KIND: u8>(problem: &mut Problem) {
    for index in 1..problem.stages.len() {
        let start = problem.start_of(index);
        let law = &mut problem.stages[index];
        if is_of_kind(law, KIND) {
            law.static_force -= law.stiffness * start;
        }
    }
}

/// Rate of decay g (1/s) and square of the frequency w² (1/s²) of every stage of stiffness, with viscosity or without, as `of` has them.
fn with_rates(problem: &mut Problem, of: impl Fn(f64, f64) -> (f64, f64)) {
    let mass = problem.mass;
    for law in problem.stages.iter_mut().filter(|law| is_of_kind(law, DAMPED) || is_of_kind(law, SPRING)) {
        let decay = 0.5 * law.viscosity / mass;
        let (decay, square) = of(decay, law.stiffness / mass - decay * decay);
        let stiffness = mass * (decay * decay + square);
        *law = Stage {
            static_force: law.static_force * (stiffness / law.stiffness),
            stiffness,
            viscosity: 2.0 * mass * decay,
            ..*law
        };
    }
}

/// The same of the stages between the right border, r² = 4 s M, and one at `border` s M.
fn with_border(problem: &mut Problem, border: f64, square: impl Fn(f64) -> f64) {
    with_rates(problem, |decay, right| {
        // r²/(s M), over which w² is positive below 4.
        let ratio = 4.0 * decay * decay / (decay * decay + right);
        let is_wrong = (ratio > border) != (ratio > 4.0);
        (decay, if is_wrong { square(right) } else { right })
    });
}

/// r²/(s M) of the stages that have a border.
fn ratios(question: &Question) -> Vec<f64> {
    let Problem { stages, mass, .. } = &question.problem;
    let ratio = |law: &Stage| law.viscosity * law.viscosity / (law.stiffness * mass);
    stages.iter().filter(|law| is_of_kind(law, DAMPED)).map(ratio).collect()
}

/// A term times a factor in stages of one kind.
macro_rules! in_kind {
    ($id:literal, $what:literal, $term:ident, $kind:ident, $stages:literal) => {
        of(
            $id,
            concat!($what, " is {} times the right one in stages of ", $stages),
            Parameter::Factor,
            &[Change::Problem(scale_in::<$term, $kind>)],
        )
    };
}

/// Faults of closed forms.
pub(super) static FAULTS: &[Hypothesis] = &[
    of(
        "damping-rate",
        "in stages of stiffness and viscosity without drag the rate of damping is {} times r/2M",
        Parameter::Factor,
        &[Change::Problem(scale_in::<VISCOSITY, DAMPED>)],
    ),
    of(
        "damping-rate",
        "in stages of stiffness and viscosity without drag the decay has {} times the rate r/2M, and the frequency is right",
        Parameter::Factor,
        &[Change::Problem(|p, n| with_rates(p, |decay, square| (n * decay, square)))],
    ),
    of(
        "damping-rate",
        "in stages of stiffness and viscosity without drag the frequency has {} times the rate r/2M, and the decay is right",
        Parameter::Factor,
        &[Change::Problem(|p, n| {
            with_rates(p, |decay, square| (decay, square + (1.0 - n * n) * decay * decay));
        })],
    ),
    of(
        "damping-border",
        "stages of stiffness, with viscosity or without, are all taken for underdamped: w² is the size of s/M - (r/2M)²",
        Parameter::None,
        &[Change::Problem(|p, _| with_rates(p, |decay, square| (decay, square.abs())))],
    ),
    of(
        "damping-border",
        "stages with r² between {} s M and 4 s M, the right border, are taken for underdamped where they are overdamped, or the \
         other way round",
        Parameter::Threshold(2.0, ratios),
        &[Change::Problem(|p, border| with_border(p, border, |square| -square))],
    ),
    of(
        "damping-border",
        "stages with r² between {} s M and 4 s M, the right border, are taken for critically damped",
        Parameter::Threshold(2.0, ratios),
        &[Change::Problem(|p, border| with_border(p, border, |_| 0.0))],
    ),
    of(
        "term:drive",
        "a static force that drives (p < 0) is left out in stages of a static force and drag",
        Parameter::None,
        &[Change::Problem(|p, _| {
            for law in p.stages.iter_mut().filter(|law| is_of_kind(law, DRAGGED)) {
                law.static_force = law.static_force.max(0.0);
            }
        })],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the start of the stage where it has stiffness, or that and a static force",
        Parameter::None,
        &[Change::Problem(|p, _| from_the_start::<SPRING>(p))],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the start of the stage where it has stiffness and viscosity, and no drag",
        Parameter::None,
        &[Change::Problem(|p, _| from_the_start::<DAMPED>(p))],
    ),
    of(
        "stiffness-origin",
        "the depth in s x is counted from the start of the stage where it has stiffness and drag, and no viscosity",
        Parameter::None,
        &[Change::Problem(|p, _| from_the_start::<BRAKED_SPRING>(p))],
    ),
    of(
        "force-stale",
        "the spring gives the force of the start of the stage throughout where it has stiffness, or that and a static force",
        Parameter::None,
        &[Change::Problem(|p, _| spring_at(p, 0.0, |law| is_of_kind(law, SPRING)))],
    ),
    of(
        "force-stale",
        "the spring gives the force of the start of the stage throughout where it has stiffness and viscosity, and no drag",
        Parameter::None,
        &[Change::Problem(|p, _| spring_at(p, 0.0, |law| is_of_kind(law, DAMPED)))],
    ),
    of(
        "force-stale",
        "the spring gives the force of the start of the stage throughout where it has stiffness and drag, and no viscosity",
        Parameter::None,
        &[Change::Problem(|p, _| spring_at(p, 0.0, |law| is_of_kind(law, BRAKED_SPRING)))],
    ),
    in_kind!("term:static-force", "the static force p", STATIC_FORCE, STEADY, "a static force alone"),
    in_kind!("term:static-force", "the static force p", STATIC_FORCE, SPRING, "a static force and stiffness"),
    in_kind!("term:static-force", "the static force p", STATIC_FORCE, VISCOUS, "a static force and viscosity"),
    in_kind!("term:static-force", "the static force p", STATIC_FORCE, DRAGGED, "a static force and drag"),
    in_kind!(
        "term:static-force",
        "the static force p",
        STATIC_FORCE,
        DAMPED,
        "a static force, stiffness and viscosity"
    ),
    in_kind!("term:stiffness", "the stiffness s", STIFFNESS, SPRING, "stiffness, or that and a static force"),
    in_kind!(
        "term:stiffness",
        "the stiffness s",
        STIFFNESS,
        DAMPED,
        "stiffness and viscosity, or these and a static force"
    ),
    in_kind!("term:viscosity", "the viscosity r", VISCOSITY, VISCOUS, "viscosity, or that and a static force"),
    in_kind!("term:drag", "the drag q", DRAG, DRAGGED, "drag, or that and a static force"),
];

#[cfg(test)]
mod tests {
    use super::super::super::simulation::solve;
    use super::*;

    /// The formula at the head of this file, with a rate and a square of the frequency of any kind.
    #[test]
    fn a_formula_with_another_rate_or_frequency_is_the_flight_through_the_changed_stage() {
        let (mass, speed) = (2.0, 30.0);
        for (viscosity, [times, square_by]) in [(20.0, [2.0, 1.0]), (90.0, [1.5, 1.0]), (70.0, [1.0, -1.0])] {
            let law = Stage { static_force: 40.0, stiffness: 900.0, viscosity, ..Stage::free() };
            let right = Problem::of_stages(mass, speed, [law]);
            let mut changed = right.clone();
            with_rates(&mut changed, |decay, square| (times * decay, square_by * square));
            let decay = 0.5 * viscosity / mass;
            let (rate, square) = (times * decay, square_by * (law.stiffness / mass - decay * decay));
            let at = |time: f64| {
                let rest = -law.static_force / law.stiffness;
                let (a, frequency) = (-rest, square.abs().sqrt());
                let b = speed + rate * a;
                let (sine, cosine) = ((frequency * time).sin(), (frequency * time).cos());
                let (odd, even) =
                    if square < 0.0 { ((frequency * time).sinh(), (frequency * time).cosh()) } else { (sine, cosine) };
                rest + (-rate * time).exp() * (a * even + b / frequency * odd)
            };
            let exit = at(0.02);
            let found = solve(&changed.with_exit(exit)).map(|found| found.end.time);
            assert!(found.is_some_and(|time| (time - 0.02).abs() < 1e-12), "{viscosity}: {found:?}");
        }
    }
}
