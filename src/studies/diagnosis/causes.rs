//! Which fault explains the answers? Each hypothesis computes what it would answer; its number is fitted.
//!
//! A cause is *certain* where it explains every failing answer to within the accuracy of the solver, contradicts no
//! passing one, and no other hypothesis of as little freedom does the same. Where no single one does, two at once are
//! tried. What only a number of its own in every answer explains is never certain.

use rayon::prelude::*;
use serde::Serialize;

use super::hypotheses::{Fault, How, Hypothesis, Parameter, Predicted, hypotheses, predicted, slips_of_scenes};
use super::questions::{Content, Question};
use crate::exchange::peers::wire::conditioning;
use crate::physics::State;

/// Failing answers that bound a number which matters only in passing those of a question, and that it may leave.
const BOUNDING: usize = 60;
/// Failing answers from which the number of a hypothesis is fitted.
const FITTED: usize = 6;
/// The same of a second fault.
const FITTED_OF_SECOND: usize = 2;
/// Failing answers that a number must explain before all of them are compared.
const TRIED: usize = 8;
/// Of so many numbers one is tried, and those between where it seems worth it.
const COARSE: usize = 4;
/// What is so near to zero, in units of the accuracy, is a root.
const NEAR_ROOT: f64 = 1e-4;
/// By how much an error changes, in units of the accuracy, that a fault leaves as it is.
const STILL: f64 = 0.01;
/// A quantity whose distance from zero is so many times its change hardly changes.
const FAR: f64 = 10.0;
/// By how much farther from an answer than the right one a prediction must be to be contradicted by it.
const FARTHER: f64 = 2.0;
/// Width of a bracket, relative to its numbers, in which a quantity that still changes much jumps.
const JUMP_WIDTH: f64 = 1e-7;
/// Rounds of a search between two numbers.
const ROUNDS_MAX: usize = 80;
/// Numbers that lie within this factor are one.
const ONE_NUMBER: f64 = 1.01;
/// Failing answers that must be explained for certainty.
pub(super) const CERTAIN_FROM: usize = 3;
/// First causes with which a second one is tried.
const FIRST_OF_TWO: usize = 5;
/// Two causes at once leave at most one failing answer of so many.
const LEFT_BY_TWO: usize = 20;
/// A law of its own may leave one failing answer of so many without a flight that can be computed.
const OPEN: usize = 5;
/// Causes listed at most.
const LISTED: usize = 5;
/// Part of the effect of a fault that an explanation may leave, up to so many times the accuracy: a solver with a fault
/// may err more than a sound one does on the same question.
const LEFT: f64 = 1e-4;
const LEFT_MAX: f64 = 100.0;
/// Part of the error that an explanation may leave, whatever the condition.
const LEFT_MOST: f64 = 0.5;
/// Largest relative difference that an explanation may leave, whatever the condition.
const EXPLAINED_MAX: f64 = 0.02;
/// Part of the right answer that is next to nothing: of a flight that a fault ends at once.
const LEAST: f64 = 1e-9;
/// An error that is so many times the allowed one tells a fault from the accuracy of a solver.
const TELLING: f64 = 10.0;

/// How sure a cause is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, strum::Display)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Certainty {
    /// It explains every answer, and nothing else does.
    Certain,
    /// It explains every answer, and so does something else; or nearly every one.
    Likely,
    /// It explains some.
    Possible,
}

/// What is wrong with a solver.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Cause {
    /// Id (`docs/reference.md`, "Diagnosis").
    pub id: String,
    /// Number over the right one; a speed for `rest-threshold`.
    pub factor: Option<f64>,
    /// How sure it is.
    pub certainty: Certainty,
    /// What is wrong, in a sentence.
    pub statement: String,
    /// Failing answers that it explains.
    pub explains: usize,
    /// Failing answers.
    pub of: usize,
    /// Largest relative difference between those answers and what the cause gives.
    pub largest_difference: Option<f64>,
}

impl Cause {
    /// A cause without a number, found otherwise than by what it would answer.
    pub(super) fn plain(id: &str, statement: String, certainty: Certainty, explains: usize, of: usize) -> Self {
        Self { id: id.to_owned(), factor: None, certainty, statement, explains, of, largest_difference: None }
    }
}

/// An answer to a question, and how near a sound one would be.
#[derive(Clone, Debug)]
pub(super) struct Seen<'a> {
    /// The question.
    pub question: &'a Question,
    /// Numbers of the answer.
    pub answer: State,
    /// How the solver works.
    pub how: How,
    /// Relative error of a sound answer, before its condition.
    pub accuracy: f64,
    /// Whether the answer fails.
    pub fails: bool,
    /// Whether only its outcome is wrong.
    pub is_misnamed: bool,
}

/// Quantities that are compared: depth, time, velocity.
type Mask = [bool; 3];
const ALL_THREE: Mask = [true; 3];

impl Seen<'_> {
    fn is_stiff(&self) -> bool {
        self.question.contains.contains(&Content::Stiff)
    }

    fn predicted(&self, faults: &[Fault<'static>]) -> Option<Predicted> {
        predicted(self.question, faults, self.how)
    }

    /// Relative errors of the answer against `end`: those of depth and time over a part of the right ones where `end` is next to nothing.
    fn errors(&self, end: State) -> [f64; 3] {
        let (right, impact_speed) = (self.question.exact.end, self.question.problem.impact_speed);
        let over = |found: f64, value: f64, scale: f64| if found == value { 0.0 } else { (found - value) / scale };
        let of = |part: fn(State) -> f64| over(part(self.answer), part(end), part(end).abs().max(LEAST * part(right)));
        [of(|state| state.depth), of(|state| state.time), over(self.answer.velocity, end.velocity, impact_speed)]
    }

    /// Errors of the answer against what is predicted, each over what is allowed.
    fn excess(&self, Predicted { end, conditions }: Predicted) -> [f64; 3] {
        let errors = self.errors(end);
        std::array::from_fn(|i| {
            let condition = conditions[i].max(self.question.conditions[i]);
            errors[i] / (self.accuracy * condition)
        })
    }

    /// Whether `excess` leaves next to nothing of what is wrong with the answer.
    fn is_near(&self, excess: [f64; 3], mask: Mask) -> bool {
        let end = self.question.exact.end;
        let wrong = self.excess(Predicted { end, conditions: conditioning(end, &self.question.problem) });
        let wrong = wrong.iter().fold(0.0, |a, b| f64::max(a, b.abs()));
        let allowed = if self.fails { (LEFT * wrong).clamp(1.0, LEFT_MAX) } else { 1.0 };
        (0..3).all(|i| !mask[i] || excess[i].abs() <= allowed)
    }

    /// Largest relative error against what `faults` give, if they explain the answer.
    fn explained_by(&self, faults: &[Fault<'static>], mask: Mask) -> Option<f64> {
        self.predicted(faults).and_then(|predicted| self.explained(predicted, mask))
    }

    /// The same of what is `predicted`.
    fn explained(&self, predicted: Predicted, mask: Mask) -> Option<f64> {
        let is_near = self.is_near(self.excess(predicted), mask);
        let largest = |errors: [f64; 3]| (0..3).filter(|i| mask[*i]).map(|i| errors[i].abs()).fold(0.0, f64::max);
        let left = largest(self.errors(predicted.end));
        // A fault under which the flight ends otherwise may magnify errors: what it leaves must be less than what it explains.
        let right = Predicted { end: self.question.exact.end, conditions: self.question.conditions };
        let is_wrong = self.fails && largest(self.excess(right)) > 1.0;
        let leaves_less = !is_wrong || left <= LEFT_MOST * largest(self.errors(right.end));
        (is_near && leaves_less && left <= EXPLAINED_MAX).then_some(left)
    }

    /// Whether `faults` give another answer, and one that is farther off than the right one. Where none can be computed, nothing is
    /// contradicted.
    fn contradicts(&self, faults: &[Fault<'static>], mask: Mask) -> bool {
        let Some(predicted) = self.predicted(faults).filter(|predicted| self.explained(*predicted, mask).is_none())
        else {
            return false;
        };
        // A right answer may be less accurate than most of this solver's.
        let right = Predicted { end: self.question.exact.end, conditions: self.question.conditions };
        let [here, at_right] = [predicted, right].map(|end| self.excess(end));
        (0..3).any(|i| mask[i] && !(here[i].abs() <= FARTHER * at_right[i].abs().max(1.0)))
    }

    /// Whether what `faults` give is another answer than the right one.
    fn is_told_apart(&self, faults: &[Fault<'static>]) -> bool {
        let (Some(found), Some(right)) = (self.predicted(faults), self.predicted(&[])) else { return false };
        let faulty = Seen { answer: found.end, ..self.clone() };
        let beyond = faulty.excess(right).iter().filter(|excess| excess.abs() > TELLING).count();
        // A number of its own in every answer explains one quantity by itself.
        let is_fitted = |(fault, _): &Fault<'_>| {
            use Parameter::{Bracket, Delay, Lateness, Nearness, Overshoot};
            matches!(fault.parameter, Delay | Lateness | Bracket | Overshoot | Nearness)
        };
        let is_of_one = |(fault, _): &Fault<'_>| is_of_one_number(fault);
        beyond > usize::from(faults.iter().any(is_fitted) && !faults.iter().any(is_of_one))
    }

    /// Numbers of `hypothesis` that explain the answer, together with `others`; `None` where no number changes it.
    fn fit(&self, hypothesis: &'static Hypothesis, others: &[Fault<'static>], mask: Mask) -> Option<Vec<f64>> {
        let with =
            |number: f64| -> Vec<Fault<'static>> { others.iter().copied().chain([(hypothesis, number)]).collect() };
        let excess = |number: f64| Some(self.excess(self.predicted(&with(number))?));
        let mut fitting: Vec<f64> = Vec::new();
        if hypothesis.changes.is_empty() {
            return Some(if self.explained_by(&with(1.0), mask).is_some() { vec![1.0] } else { fitting });
        }
        let mut add = |number: f64| {
            let is_new = fitting.iter().all(|known| (known - number).abs() > 1e-9 * number.abs());
            if is_new && self.explained_by(&with(number), mask).is_some() {
                fitting.push(number);
            }
        };
        let grid = hypothesis.parameter.grid(self.question);
        let is_discrete = matches!(
            hypothesis.parameter,
            Parameter::None | Parameter::Choice(_) | Parameter::OneOf(_) | Parameter::Threshold(..)
        );
        let coarse = if is_discrete { 1 } else { COARSE };
        let ends = || (0..grid.len()).step_by(coarse).chain(std::iter::once(grid.len() - 1));
        let mut values: Vec<Option<Option<[f64; 3]>>> = vec![None; grid.len()];
        ends().for_each(|index| values[index] = Some(excess(grid[index])));
        // What does not concern this flight leaves it as it is, whatever the number.
        let is_moved = if grid.len() > 1 {
            ends().any(|index| values[index] != values[0])
        } else {
            let still = self.predicted(others).map(|still| self.excess(still));
            // Simulated, it differs by round-off.
            let differs = |(one, other): (f64, f64)| !((one - other).abs() <= STILL);
            values[0].flatten().zip(still).is_none_or(|(one, other)| one.into_iter().zip(other).any(differs))
        };
        if !is_moved {
            return None;
        }
        let crosses = |low: [f64; 3], high: [f64; 3]| (0..3).filter(move |i| mask[*i] && low[*i] * high[*i] < 0.0);
        if !is_discrete {
            // Finer between those where a quantity passes the answer, or where no flight is known.
            let bounds: Vec<usize> = ends().collect();
            for pair in bounds.windows(2) {
                let is_passed = match (values[pair[0]].flatten(), values[pair[1]].flatten()) {
                    (Some(low), Some(high)) => crosses(low, high).next().is_some(),
                    (None, None) => false,
                    _ => true,
                };
                if is_passed {
                    (pair[0] + 1..pair[1]).for_each(|index| values[index] = Some(excess(grid[index])));
                }
            }
        }
        let known: Vec<(f64, [f64; 3])> =
            grid.iter().zip(&values).filter_map(|(number, value)| Some((*number, value.flatten()?))).collect();
        for (number, excess) in &known {
            if self.is_near(*excess, mask) {
                add(*number);
            }
        }
        if is_discrete {
            return Some(fitting);
        }
        for pair in known.windows(2) {
            let [(_, low), (_, high)] = [pair[0], pair[1]];
            // The number is a root in every quantity that it moves: the one that it moves most tells.
            let moves = |i: &usize| (high[*i] - low[*i]).abs();
            if let Some(quantity) = crosses(low, high).max_by(|a, b| moves(a).total_cmp(&moves(b)))
                && let Some(root) = root([pair[0], pair[1]], quantity, mask, excess)
            {
                add(root);
            }
        }
        Some(fitting)
    }
}

/// Whether a number of its own in every answer moves one number of that answer alone: that proves little.
fn is_of_one_number(fault: &Hypothesis) -> bool {
    fault.id.starts_with("event-time") || ["velocity-stale", "exit-velocity-late"].contains(&fault.id)
}

/// A root of the quantity `which` of `excess` between two numbers at which its signs differ.
///
/// `None` too where no number between the two explains an answer: another quantity of `mask` hardly changes from one to the
/// other, far from zero, or this one jumps over zero.
fn root(
    [mut low, mut high]: [(f64, [f64; 3]); 2],
    which: usize,
    mask: Mask,
    excess: impl Fn(f64) -> Option<[f64; 3]>,
) -> Option<f64> {
    let moved = |low: [f64; 3], high: [f64; 3], i: usize| (high[i] - low[i]).abs();
    let is_elsewhere = |low: [f64; 3], high: [f64; 3]| {
        let least = |i: usize| if low[i] * high[i] > 0.0 { low[i].abs().min(high[i].abs()) } else { 0.0 };
        (0..3).any(|i| mask[i] && i != which && least(i) > (FAR * moved(low, high, i)).max(2.0 * LEFT_MAX))
    };
    let at_first = moved(low.1, high.1, which);
    // As Illinois has it: the value at an end that stays is halved.
    let (mut g_low, mut g_high) = (low.1[which], high.1[which]);
    for round in 0..ROUNDS_MAX {
        let (width, size) = (high.0 - low.0, high.0.abs().max(low.0.abs()));
        if width <= f64::EPSILON * size {
            break;
        }
        let jumps = width <= JUMP_WIDTH * size && moved(low.1, high.1, which) > (at_first / FAR).max(FAR * LEFT_MAX);
        if jumps || is_elsewhere(low.1, high.1) {
            return None;
        }
        let falsi = low.0 - g_low * width / (g_high - g_low);
        let next = if round % 3 == 2 || !(low.0 < falsi && falsi < high.0) { 0.5 * (low.0 + high.0) } else { falsi };
        let values = excess(next)?;
        let value = values[which];
        if value.abs() < NEAR_ROOT {
            return Some(next);
        }
        if (value < 0.0) == (g_low < 0.0) {
            (low, g_low) = ((next, values), value);
            g_high *= 0.5;
        } else {
            (high, g_high) = ((next, values), value);
            g_low *= 0.5;
        }
    }
    Some(if g_low.abs() < g_high.abs() { low.0 } else { high.0 })
}

/// `number`, or the round one that it is within its accuracy.
fn rounded(number: f64) -> impl Iterator<Item = f64> {
    let zero = (number != 0.0 && number.abs() < 1e-4).then_some(0.0);
    let ratios = [1.0, 2.0, 3.0, 4.0, 8.0, std::f64::consts::PI];
    let ratios = ratios.into_iter().flat_map(move |by| [(number * by).round() / by, (number / by).round() * by]);
    let decimals = (0..3).map(move |digits| {
        let unit = 10f64.powf(f64::from(digits) - number.abs().log10().floor());
        (number * unit).round() / unit
    });
    let is_near = move |round: &f64| *round != number && (round - number).abs() <= 1e-4 * number.abs();
    std::iter::once(number).chain(ratios.chain(decimals).filter(is_near)).chain(zero)
}

/// How well faults explain what was seen.
#[derive(Clone, Debug)]
struct Explanation {
    faults: Vec<(&'static Hypothesis, f64)>,
    /// Whether each failing answer is explained; `None` where what the faults give cannot be computed.
    explained: Vec<Option<bool>>,
    /// Failing answers explained that differ from the right ones.
    told_apart: usize,
    largest: f64,
    /// Whether the numbers of all answers, over depth or time, are one number: then it is no matter of steps.
    is_one_number: bool,
}

impl Explanation {
    fn count(&self) -> usize {
        self.explained.iter().filter(|is| **is == Some(true)).count()
    }

    /// Failing answers of which it says anything.
    fn concerned(&self) -> usize {
        self.explained.iter().flatten().count()
    }

    /// Whether it explains every answer that it can, and there is something to explain.
    fn is_full(&self) -> bool {
        // What says nothing of most answers explains few by its freedom.
        let says_enough = self.concerned() == self.explained.len() || self.concerned() >= 2 * CERTAIN_FROM;
        says_enough && self.told_apart > 0 && self.explained.iter().all(|is| *is != Some(false))
    }

    /// Whether a factor of it is one to within the accuracy: then nothing is wrong by it.
    fn is_of_nothing(&self, accuracy: f64) -> bool {
        self.faults.iter().any(|(fault, number)| {
            matches!(fault.parameter, Parameter::Factor | Parameter::Unit) && (number - 1.0).abs() <= TELLING * accuracy
        })
    }

    fn freedom(&self) -> u32 {
        self.faults.iter().map(|(fault, _)| 1 + u32::from(fault.parameter.freedom())).sum()
    }
}

/// What was seen, parted into failing and passing answers.
struct Evidence<'a> {
    failing: Vec<&'a Seen<'a>>,
    passing: Vec<&'a Seen<'a>>,
    /// Failing answers that an explanation may leave before it is dropped.
    left: usize,
}

impl Evidence<'_> {
    /// How well `hypothesis` with `number`, or a number of its own in every answer, explains all, beside `others`; `None`
    /// once it contradicts a passing answer, or leaves too many failing ones.
    fn explain(
        &self,
        hypothesis: &'static Hypothesis,
        number: f64,
        others: &[Fault<'static>],
        mask: Mask,
    ) -> Option<Explanation> {
        let is_per_answer = hypothesis.parameter.is_per_answer();
        let with =
            |number: f64| -> Vec<Fault<'static>> { others.iter().copied().chain([(hypothesis, number)]).collect() };
        // Where each answer has a number of its own, a passing one has that of no fault.
        let of_passing = if is_per_answer { others.to_vec() } else { with(number) };
        if !of_passing.is_empty() && self.passing.iter().any(|seen| seen.contradicts(&of_passing, mask)) {
            return None;
        }
        let mut found = Explanation {
            faults: with(number),
            explained: Vec::with_capacity(self.failing.len()),
            told_apart: 0,
            largest: 0.0,
            is_one_number: false,
        };
        let (mut left, mut open, open_max) = (0, 0, self.failing.len() / OPEN);
        let mut shares: Vec<f64> = Vec::new();
        let mut greatest = 0.0_f64;
        for seen in &self.failing {
            let is_silent = match hypothesis.parameter {
                Parameter::Bracket => seen.question.exact.events.len() > 1,
                Parameter::Overshoot => seen.question.contains.contains(&Content::SeveralStageEnds),
                _ => false,
            };
            if is_silent {
                found.explained.push(None);
                continue;
            }
            let fitted = || seen.fit(hypothesis, others, mask)?.first().copied();
            let number = if is_per_answer { fitted() } else { Some(number) };
            shares.extend(number.and_then(|number| hypothesis.parameter.share(number, seen.question)));
            greatest = greatest.max(number.unwrap_or(0.0));
            let faults = number.map(with);
            let difference = faults.as_ref().and_then(|faults| seen.explained_by(faults, mask));
            // A flight that is stiff, or whose force jumps on its way, may take more steps than a simulation has.
            let is_open = |faults: &Vec<Fault<'static>>| {
                let has_law = || faults.iter().any(|(fault, _)| fault.has_law());
                (seen.is_stiff() || (open < open_max && has_law())) && seen.predicted(faults).is_none()
            };
            let is_left = difference.is_none() && !faults.as_ref().is_some_and(is_open);
            open += usize::from(difference.is_none() && !is_left);
            found.explained.push(if difference.is_none() && !is_left { None } else { Some(!is_left) });
            left += usize::from(is_left);
            if left > self.left {
                return None;
            }
            if let Some((difference, faults)) = difference.zip(faults) {
                found.largest = found.largest.max(difference);
                // Only that an outcome is misnamed explains a misnamed one.
                let is_told =
                    if seen.is_misnamed { hypothesis.changes.is_empty() } else { seen.is_told_apart(&faults) };
                found.told_apart += usize::from(is_told);
            }
        }
        if matches!(hypothesis.parameter, Parameter::Bracket) {
            found.faults = with(greatest);
        }
        shares.sort_by(f64::total_cmp);
        // The middle half alone: an answer may have two fitting numbers.
        let of_part = |part: usize| shares.get(part * shares.len() / 4).copied().unwrap_or(0.0);
        found.is_one_number = shares.len() >= CERTAIN_FROM && of_part(3) <= ONE_NUMBER * of_part(1);
        Some(found).filter(|found| found.count() > 0)
    }

    /// A number of a hypothesis that matters only in passing the `cuts` of a question: one that all answers leave open.
    fn between_cuts(
        &self,
        hypothesis: &'static Hypothesis,
        cuts: fn(&Question) -> Vec<f64>,
        others: &[Fault<'static>],
        mask: Mask,
    ) -> Option<f64> {
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut left = 0;
        for seen in self.failing.iter().take(BOUNDING).chain(&self.passing) {
            let mut all = cuts(seen.question);
            all.retain(|cut| low < *cut && *cut < high);
            all.sort_by(f64::total_cmp);
            let bounds: Vec<f64> = std::iter::once(low).chain(all).chain([high]).collect();
            let fits = |pair: &[f64]| {
                let faults: Vec<_> = others.iter().copied().chain([(hypothesis, inside(pair[0], pair[1]))]).collect();
                if seen.fails { seen.explained_by(&faults, mask).is_some() } else { !seen.contradicts(&faults, mask) }
            };
            // What the flight does not meet leaves several intervals open.
            let open: Vec<bool> = bounds.windows(2).map(fits).collect();
            match open.iter().position(|is_open| *is_open) {
                Some(from) => {
                    let count = open[from..].iter().take_while(|is_open| **is_open).count();
                    (low, high) = (bounds[from], bounds[from + count]);
                }
                None if seen.fails => left += 1,
                None => return None,
            }
            if left > self.left.min(BOUNDING / 2) {
                return None;
            }
        }
        (low > 0.0 || high < f64::INFINITY).then(|| inside(low, high))
    }

    /// The best explanation by `hypothesis`, if it explains anything.
    fn best(
        &self,
        hypothesis: &'static Hypothesis,
        others: &[Fault<'static>],
        unexplained: &[usize],
        mask: Mask,
    ) -> Option<Explanation> {
        let fitted = if others.is_empty() { FITTED } else { FITTED_OF_SECOND };
        // Those that meet least, and some of all.
        let step = (unexplained.len() / TRIED).max(1);
        let spread = unexplained.iter().skip(TRIED).step_by(step).take(TRIED);
        let sample: Vec<usize> = unexplained.iter().take(TRIED).chain(spread).copied().collect();
        let needed = if sample.len() > TRIED { 2 } else { 1 };
        if hypothesis.parameter.is_per_answer() {
            let is_fitted =
                |index: &&usize| self.failing[**index].fit(hypothesis, others, mask).is_some_and(|all| !all.is_empty());
            let some = sample.iter().take(fitted).filter(is_fitted).count();
            let is_tried = matches!(hypothesis.parameter, Parameter::Bracket) || some >= needed.min(fitted / 2);
            return is_tried.then(|| self.explain(hypothesis, 1.0, others, mask)).flatten();
        }
        if let Parameter::Threshold(_, cuts) = hypothesis.parameter {
            let number = self.between_cuts(hypothesis, cuts, others, mask)?;
            return self.explain(hypothesis, number, others, mask);
        }
        let mut numbers: Vec<f64> = Vec::new();
        let mut unfitted = 0;
        for index in unexplained.iter().take(fitted) {
            let Some(fitting) = self.failing[*index].fit(hypothesis, others, mask) else { continue };
            unfitted += usize::from(fitting.is_empty());
            // What changes three answers and explains none explains few; it may leave fewer where all must be explained.
            if unfitted > self.left.min(2) && numbers.is_empty() {
                return None;
            }
            for number in fitting {
                if numbers.iter().all(|known| (known - number).abs() > 1e-12 * number.abs()) {
                    numbers.push(number);
                }
            }
        }
        let tried = |number: f64| {
            let faults: Vec<_> = others.iter().copied().chain([(hypothesis, number)]).collect();
            let explained = |index: &&usize| self.failing[**index].explained_by(&faults, mask).is_some();
            sample.iter().filter(explained).count()
        };
        let all = numbers.into_iter().flat_map(rounded);
        let (count, number) = all.map(|number| (tried(number), number)).max_by_key(|(count, _)| *count)?;
        if count < needed {
            return None;
        }
        self.explain(hypothesis, number, others, mask)
    }
}

/// A number between two: the roundest, as people choose them.
fn inside(low: f64, high: f64) -> f64 {
    let (least, most) = (low.max(high.min(1.0) * 1e-6), high.min(low.max(1e-12) * 1e6));
    let middle = (least * most).sqrt();
    let decade = 10f64.powf(middle.log10().round());
    let near = [1.0, 0.1, 10.0].map(|by| by * decade);
    let round = [1.0, 5.0, 2.0, 3.0, 1.5, 2.5, 4.0, 6.0, 7.0, 8.0, 9.0];
    let all = round.iter().flat_map(|digit| near.map(|decade| digit * decade));
    all.into_iter().find(|number| low < *number && *number < high).unwrap_or(middle)
}

/// How far causes are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Effort {
    /// What explains all: the others are dropped at the first answer that they do not explain.
    All,
    /// What explains nearly all.
    Nearly,
    /// What explains some.
    Some,
    /// Two at once too.
    Pairs,
}

impl Effort {
    /// Failing answers of `of` that an explanation may leave.
    fn may_leave(self, of: usize) -> usize {
        match self {
            Self::All => 0,
            Self::Nearly => of / 10,
            Self::Some => of - of / 4,
            Self::Pairs => of - of / 20,
        }
    }
}

/// What explains the failing answers of `seen`, best first; `others` are all questions, asked or not, on which two
/// causes may differ.
pub(super) fn causes(seen: &[Seen<'_>], reads_scene: bool, others: &[&Question], effort: Effort) -> Vec<Cause> {
    let mut failing: Vec<&Seen<'_>> = seen.iter().filter(|seen| seen.fails).collect();
    // What meets least says most; a stiff flight takes the longest.
    failing.sort_by_key(|seen| (seen.is_stiff(), seen.question.contains.len()));
    let of = failing.len();
    if of == 0 {
        return Vec::new();
    }
    let evidence =
        Evidence { failing, passing: seen.iter().filter(|seen| !seen.fails).collect(), left: effort.may_leave(of) };
    // A slip explains all, or it says nothing.
    let slips = if reads_scene && effort <= Effort::Nearly { slips_of_scenes() } else { &[] };
    let usable: Vec<&'static Hypothesis> = hypotheses()
        .chain(slips)
        .filter(|hypothesis| reads_scene || !hypothesis.needs_scene())
        .filter(|hypothesis| hypothesis.id != "outcome-name" || evidence.failing.iter().all(|seen| seen.is_misnamed))
        .collect();
    let everything: Vec<usize> = (0..of).collect();
    let mut found: Vec<Explanation> =
        usable.par_iter().filter_map(|hypothesis| evidence.best(hypothesis, &[], &everything, ALL_THREE)).collect();
    let mut accuracies: Vec<f64> = evidence.failing.iter().map(|seen| seen.accuracy).collect();
    accuracies.sort_by(f64::total_cmp);
    found.retain(|found| !found.is_of_nothing(accuracies[of / 2]));
    found.sort_by_key(|explanation| (of - explanation.count(), explanation.freedom()));
    let is_nearly_full = |found: &Explanation| found.told_apart * 10 >= of * 9;
    if effort == Effort::Pairs && !found.iter().any(|found| found.is_full() || is_nearly_full(found)) {
        let strict =
            Evidence { left: of / LEFT_BY_TWO, failing: evidence.failing.clone(), passing: evidence.passing.clone() };
        found.extend(pairs(&strict, &usable, &found));
    }
    let mut full: Vec<&Explanation> = found.iter().filter(|explanation| explanation.is_full()).collect();
    full.sort_by_key(|explanation| explanation.freedom());
    if let Some(simplest) = full.first() {
        let rivals: Vec<&&Explanation> =
            full.iter().filter(|explanation| explanation.freedom() == simplest.freedom()).collect();
        // A number that lies between those of the questions fits by chance where few are asked: whatever else explains all is a rival.
        let is_cut = simplest.faults.iter().any(|(fault, _)| matches!(fault.parameter, Parameter::Threshold(..)));
        let is_rivalled = is_cut && full.len() > rivals.len();
        return named(&rivals, is_rivalled, &evidence, seen, others);
    }
    // What explains a few answers by its freedom explains nothing.
    found.retain(|explanation| 4 * explanation.told_apart >= explanation.concerned().max(of / 4));
    let is_of_nearly_all =
        |found: &Explanation| found.count() * 10 >= found.concerned() * 9 && found.count() >= CERTAIN_FROM;
    // Of those that explain nearly all the one of least freedom says most.
    found.sort_by_key(|found| {
        let nearly_all = is_of_nearly_all(found);
        (!nearly_all, if nearly_all { found.freedom() } else { 0 }, of - found.count(), found.freedom())
    });
    let mut causes: Vec<Cause> = Vec::new();
    for explanation in found.iter().take(LISTED) {
        let nearly_all = is_of_nearly_all(explanation);
        let certainty = if nearly_all { Certainty::Likely } else { Certainty::Possible };
        causes.extend(explanation.faults.iter().map(|fault| cause(*fault, explanation, certainty)));
    }
    causes.dedup_by(|a, b| a.id == b.id && a.statement == b.statement);
    causes.truncate(LISTED);
    causes
}

fn cause((hypothesis, number): Fault<'static>, explanation: &Explanation, certainty: Certainty) -> Cause {
    let parameter = hypothesis.parameter;
    Cause {
        id: hypothesis.id.to_owned(),
        factor: parameter.is_factor().then_some(number),
        certainty,
        statement: hypothesis.says(number),
        explains: explanation.count(),
        of: explanation.explained.len(),
        largest_difference: Some(explanation.largest),
    }
}

/// Whether two explanations answer every question alike.
fn are_twins(a: &Explanation, b: &Explanation, seen: &Seen<'_>, others: &[&Question]) -> bool {
    others.iter().all(|question| {
        let of = |explanation: &Explanation| predicted(question, &explanation.faults, seen.how);
        match (of(a), of(b)) {
            (Some(a), Some(b)) => {
                let seen = Seen { question, answer: b.end, ..seen.clone() };
                seen.excess(a).iter().all(|excess| excess.abs() <= 1.0)
            }
            (None, None) => true,
            _ => false,
        }
    })
}

/// The causes of explanations that hold equally well.
fn named(
    rivals: &[&&Explanation],
    is_rivalled: bool,
    evidence: &Evidence<'_>,
    seen: &[Seen<'_>],
    others: &[&Question],
) -> Vec<Cause> {
    let first = rivals[0];
    let is_per_answer = first.faults.iter().any(|(fault, _)| fault.parameter.is_per_answer());
    let is_same = |rival: &&&&Explanation| {
        let ids = |explanation: &Explanation| explanation.faults.iter().map(|(fault, _)| fault.id).collect::<Vec<_>>();
        ids(rival) == ids(first) || (!is_per_answer && are_twins(first, rival, &seen[0], others))
    };
    let is_alone = rivals.iter().all(|rival| is_same(&rival));
    // One number fitted to one number proves nothing.
    let is_of_one = first.faults.iter().any(|(fault, _)| is_of_one_number(fault));
    let is_enough = first.told_apart >= if evidence.passing.is_empty() { 2 * CERTAIN_FROM } else { CERTAIN_FROM };
    // Places of their own in every answer are also those of faults that nobody has thought of.
    let is_certain = is_alone && !is_rivalled && !first.is_one_number && !is_of_one && !is_per_answer && is_enough;
    let certainty = if is_certain { Certainty::Certain } else { Certainty::Likely };
    let mut causes: Vec<Cause> = Vec::new();
    // Those that cannot be distinguished are one cause.
    for rival in rivals.iter().take(if is_alone { 1 } else { LISTED }) {
        for fault in &rival.faults {
            let next = cause(*fault, rival, certainty);
            if causes.iter().all(|known| known.id != next.id) {
                causes.push(next);
            }
        }
    }
    causes
}

/// Two faults at once, where no one explains all.
fn pairs(evidence: &Evidence<'_>, usable: &[&'static Hypothesis], singles: &[Explanation]) -> Vec<Explanation> {
    let of = evidence.failing.len();
    let mut firsts: Vec<(Explanation, Mask)> = singles
        .iter()
        .filter(|single| single.told_apart > 0 && 20 * single.count() >= of)
        .map(|single| (single.clone(), ALL_THREE))
        .collect();
    // A fault of the report hides the others in one quantity.
    for hidden in 0..3 {
        let mask: Mask = std::array::from_fn(|i| i != hidden);
        let everything: Vec<usize> = (0..of).collect();
        let masked: Vec<Explanation> =
            usable.par_iter().filter_map(|hypothesis| evidence.best(hypothesis, &[], &everything, mask)).collect();
        firsts.extend(
            masked.into_iter().filter(|found| found.count() == of && found.told_apart > 0).map(|found| (found, mask)),
        );
    }
    firsts.sort_by_key(|(single, _)| (of - single.count(), single.freedom()));
    let mut found = Vec::new();
    for (first, mask) in
        firsts.iter().filter(|(single, _)| !single.faults[0].0.parameter.is_per_answer()).take(FIRST_OF_TWO)
    {
        let missing: Vec<usize> = if *mask == ALL_THREE {
            first.explained.iter().enumerate().filter_map(|(index, is)| (*is == Some(false)).then_some(index)).collect()
        } else {
            (0..of).collect()
        };
        // Two numbers of its own in every answer would explain anything.
        let is_free = |second: &Hypothesis| matches!(second.parameter, Parameter::Nearness);
        let others = usable
            .par_iter()
            .filter(|second| !is_free(second))
            .filter(|second| !std::ptr::eq(**second, first.faults[0].0));
        let both = others.filter_map(|second| evidence.best(second, &first.faults, &missing, ALL_THREE));
        found.extend(both.collect::<Vec<_>>());
        if !found.is_empty() {
            break;
        }
    }
    found
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::super::questions::questions;
    use super::*;

    /// How far a passing answer lies from the right one, in units of the accuracy.
    const OFF: f64 = 1.9;

    fn hypothesis(id: &str) -> &'static Hypothesis {
        hypotheses().find(|hypothesis| hypothesis.id == id).unwrap()
    }

    #[test]
    fn a_passing_answer_contradicts_no_fault_that_leaves_its_flight_as_it_is() {
        let (accuracy, origin, drag) = (1e-9, hypothesis("stiffness-origin"), hypothesis("term:drag"));
        let (mut left, mut contradicted) = (0, 0);
        for question in &questions(5, 100, false) {
            if question.problem.stages.len() > 1 || question.problem.impact_speed == 0.0 || question.is_on_a_border() {
                continue;
            }
            let end = question.exact.end;
            let answer = State { time: end.time * (1.0 + OFF * accuracy * question.conditions[1]), ..end };
            let (how, fails, is_misnamed) = (How::Exact, false, false);
            let seen = Seen { question, answer, how, accuracy, fails, is_misnamed };
            assert!(!seen.contradicts(&[(origin, 1.0)], ALL_THREE), "{}", question.id);
            assert!(seen.fit(origin, &[], ALL_THREE).is_none(), "{}", question.id);
            left += 1;
            contradicted += usize::from(seen.contradicts(&[(drag, 1.25)], ALL_THREE));
        }
        assert!(left > 5 && contradicted > 3, "{left} {contradicted}");
    }
}
