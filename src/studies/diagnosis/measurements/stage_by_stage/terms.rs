//! Which term of the force, times which factor, gives the wrong passages? For a term that is wrong in some stages or states alone, of which
//! no hypothesis about whole flights knows.

use super::super::super::simulation::solve;
use super::{Passage, TERMS, Way};
use crate::exchange::peers::wire::errors;
use crate::physics::State;

/// Factors between which one is looked for, ascending.
const GRID: [f64; 15] = [-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.1, 0.3, 0.6, 0.9, 1.2, 2.0, 4.0, 10.0, 30.0];
/// Difference of a passage from that with a factor, and of factors that are one.
const FITS: f64 = 1e-6;
/// Wrong passages that have one factor, and the part of them.
const ENOUGH: usize = 3;
const SOME: f64 = 0.3;
/// Rounds of a search between two factors.
const ROUNDS_MAX: usize = 80;

/// A term with a factor.
pub(super) struct Factored {
    /// Its place among [`TERMS`].
    pub term: usize,
    pub factor: f64,
    /// Wrong passages that it gives.
    pub count: usize,
}

/// The term with the factor that gives most of `wrong`.
pub(super) fn factored(wrong: &[&Passage<'_>]) -> Option<Factored> {
    let of_term = |term: usize| {
        let is_one = |from: f64, to: f64| (to - from).abs() <= FITS * to.abs().max(1.0);
        let factors = wrong.iter().filter_map(|passage| fitted(passage, term));
        let mut factors: Vec<f64> = factors.filter(|factor| !is_one(1.0, *factor)).collect();
        factors.sort_by(f64::total_cmp);
        let runs = (0..factors.len()).map(|first| {
            let count = factors[first..].iter().take_while(|factor| is_one(factors[first], **factor)).count();
            Factored { term, factor: factors[first + count / 2], count }
        });
        runs.max_by_key(|run| run.count)
    };
    let best = (0..TERMS.len()).filter_map(of_term).max_by_key(|run| run.count)?;
    (best.count >= ENOUGH && best.count as f64 >= SOME * wrong.len() as f64).then_some(best)
}

/// The end of `passage` with a term times `factor`.
fn end_with(passage: &Passage<'_>, term: usize, factor: f64) -> Option<State> {
    let mut problem = passage.alone.clone();
    let law = &mut problem.stages[0];
    let terms = [&mut law.static_force, &mut law.stiffness, &mut law.viscosity, &mut law.drag];
    // Alone a stage begins at zero: what its spring has there is part of the static force.
    let at_start = passage.law.stiffness * passage.from.depth;
    let of_spring = if term == 1 { (factor - 1.0) * at_start } else { 0.0 };
    let own = if term == 0 { at_start } else { 0.0 };
    terms.into_iter().enumerate().filter(|(at, _)| *at == term).for_each(|(_, of)| *of = own + factor * (*of - own));
    problem.stages[0].static_force += of_spring;
    solve(&problem).map(|flight| flight.end)
}

/// The factor of a term that gives `passage`.
fn fitted(passage: &Passage<'_>, term: usize) -> Option<f64> {
    // All flights to rest by one term are one flight in other units: whatever is wrong has one factor there.
    let is_one_flight = passage.way == Way::Rest && passage.terms().iter().filter(|has| **has).count() == 1;
    if !passage.terms()[term] || is_one_flight {
        return None;
    }
    let which = match (passage.found.velocity > 0.0 && passage.way != Way::Rest, passage.wrong) {
        (true, [_, _, true]) => |state: State| state.velocity,
        (false, [true, ..]) => |state: State| state.depth,
        _ => |state: State| state.time,
    };
    let off = |factor: f64| end_with(passage, term, factor).map(|end| which(end) - which(passage.found));
    let known: Vec<(f64, f64)> = GRID.into_iter().filter_map(|factor| Some((factor, off(factor)?))).collect();
    let fits = |factor: &f64| {
        let off = end_with(passage, term, *factor).map(|end| errors(passage.found, end, passage.from.velocity));
        off.is_some_and(|off| off.iter().all(|off| off.abs() <= FITS))
    };
    let mut roots = known.windows(2).filter(|pair| pair[0].1 * pair[1].1 <= 0.0).filter_map(|pair| {
        let [(mut low, at_low), (mut high, _)] = [pair[0], pair[1]];
        for _ in 0..ROUNDS_MAX {
            let middle = 0.5 * (low + high);
            if (off(middle)? <= 0.0) == (at_low <= 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        // Zero is found as nearly nothing.
        let middle = 0.5 * (low + high);
        Some(if middle.abs() <= FITS { 0.0 } else { middle })
    });
    roots.find(fits)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::super::super::super::questions::{Content, Question, questions};
    use super::super::{RIGHT_AND_WRONG, judged};
    use super::*;

    /// The wrong passages of a solver that has the second stage with a `term` times `factor`.
    fn wrong_passages(questions: &[Question], term: usize, factor: f64) -> Vec<Passage<'_>> {
        let is_plain = |question: &&Question| {
            question.problem.stages.len() > 1
                && ![Content::NoSpeed, Content::WeakTerm, Content::Stiff]
                    .iter()
                    .any(|one| question.contains.contains(one))
        };
        let passage = |question: &'_ Question| {
            let mut problem = question.problem.clone();
            let law = &mut problem.stages[1];
            let terms = [&mut law.static_force, &mut law.stiffness, &mut law.viscosity, &mut law.drag];
            terms.into_iter().enumerate().filter(|(at, _)| *at == term).for_each(|(_, of)| *of *= factor);
            let flight = solve(&problem)?;
            let state = |index: usize| flight.passed.iter().find(|(stage, _)| *stage == index).map(|(_, state)| *state);
            Some([state(0)?, state(1).unwrap_or(flight.end)])
        };
        let of_plain = questions.iter().filter(is_plain);
        let judged = of_plain.filter_map(|question| {
            let boundary = question.problem.stages[1].end.min(question.problem.exit_depth);
            judged(question, 1, passage(question)?, boundary, RIGHT_AND_WRONG[0])
        });
        judged.filter(Passage::is_wrong).collect()
    }

    #[test]
    fn the_factor_of_each_term_is_found_in_a_stage_behind_another() {
        let questions = questions(13, 300, false);
        for (term, name) in TERMS.into_iter().enumerate() {
            for factor in [0.0, 1.3] {
                let wrong = wrong_passages(&questions, term, factor);
                let wrong: Vec<&Passage<'_>> = wrong.iter().collect();
                let found = factored(&wrong).unwrap();
                assert_eq!(found.term, term);
                assert!((found.factor - factor).abs() <= 2.0 * FITS, "{}", found.factor);
                assert!(10 * found.count >= 7 * wrong.len(), "{name}: {} of {}", found.count, wrong.len());
            }
        }
    }
}
