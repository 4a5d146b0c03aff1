//! Where in a step are ends taken wrongly? Exits that lie close to each other, over many steps: where the interpolant of a step
//! (its dense output) is less accurate than the step, the error rises and falls between each two ends of steps.
//!
//! A cubic by values and slopes at both ends of a step, with a slope that is off by d, is off by `h d u (1 - u)²` at the part `u`
//! of the step if it is the slope at its start, and by `h d u² (1 - u)` if it is that at its end: most at a third, or at two thirds.
//! A step that is shortened to land on an exit, by a scheme of a lower order, is off by ever more up to the whole step.

use super::super::causes::{Cause, Certainty};
use super::super::{ALLOWED, Asking, QUANTITIES, TOLERANCES};
use super::ends;
use crate::exchange::peers::PeerRequest;
use crate::exchange::peers::wire::errors;
use crate::physics::{Problem, Stage};

/// Exits, and the depths (m) of the first and the last.
const EXITS: usize = 320;
const DEPTHS: [f64; 2] = [0.05, 1.25];
/// Error at the ends of a step over that within it, at most.
const AT_ENDS: f64 = 0.15;
/// Steps that must show it, and the part of all that do.
const STEPS: usize = 3;
const STEPS_PART: f64 = 0.75;
/// Exits from one end of a step to the next at least.
const LEAST: usize = 5;
/// Part of a step by which the place of the largest error differs from its middle where a slope is wrong.
const OFF_MIDDLE: f64 = 0.09;
/// Part of a step behind which the error is largest where it is that of a shortened step.
const ALMOST_WHOLE: f64 = 0.9;
/// Halvings of a step that are told, at least and at most: a time that counts half a step for a whole one is no search by halving.
const HALVINGS: [i32; 2] = [4, 24];
/// By how much a time over a part of the step may differ from an integer.
const MULTIPLE: f64 = 1e-6;
/// Fixed step (s): some ten of them pass all exits.
const STEP: f64 = 1.7e-3;

/// The error of one quantity within a step: its bounds in the row of exits.
struct Lobe {
    from: usize,
    to: usize,
}

impl Lobe {
    fn peak(&self, errors: &[f64]) -> usize {
        let largest = (self.from..=self.to).max_by(|a, b| errors[*a].abs().total_cmp(&errors[*b].abs()));
        largest.unwrap_or(self.from)
    }

    /// Whether the error rises and then falls, from next to nothing to next to nothing.
    fn is_one(&self, errors: &[f64]) -> bool {
        const LEVEL: f64 = 1.02;
        let peak = self.peak(errors);
        // Of the sign of the largest.
        let error = |i: usize| errors[i] * errors[peak].signum();
        let is_low = [self.from, self.to].into_iter().all(|end| error(end).abs() <= AT_ENDS * error(peak));
        let rises = (self.from + 1..peak).all(|i| error(i) > 0.0 && error(i) <= LEVEL * error(i + 1));
        let falls = (peak + 1..self.to).all(|i| error(i) > 0.0 && error(i) <= LEVEL * error(i - 1));
        self.to - self.from >= LEAST && is_low && rises && falls
    }
}

/// The rows between the lowest errors.
fn lobes(errors: &[f64]) -> Vec<Lobe> {
    let error = |i: usize| errors[i].abs();
    let largest = (0..errors.len()).map(error).fold(0.0, f64::max);
    let is_lowest =
        |i: &usize| error(*i) <= error(*i - 1) && error(*i) < error(*i + 1) && error(*i) <= AT_ENDS * largest;
    let lowest: Vec<usize> = (1..errors.len() - 1).filter(is_lowest).collect();
    lowest.windows(2).map(|pair| Lobe { from: pair[0], to: pair[1] }).collect()
}

/// Whether ends are taken less accurately than steps are.
pub(super) fn measured(asking: &mut Asking<'_>, is_fixed: bool) -> Option<Cause> {
    if is_fixed {
        return at_setting(asking, TOLERANCES[0], Some(STEP));
    }
    TOLERANCES[..2].iter().find_map(|rtol| at_setting(asking, *rtol, None))
}

/// How often a `step` (s) is halved so that all `times` are multiples of a part; none where they are those of whole steps.
fn halvings(times: &[f64], step: f64) -> Option<i32> {
    let are_multiples = |halvings: i32| {
        let parts = times.iter().map(|time| time / step * 2f64.powi(halvings));
        parts.map(|part| (part - part.round()).abs()).all(|off| off <= MULTIPLE)
    };
    (0..=HALVINGS[1]).find(|halvings| are_multiples(*halvings)).filter(|halvings| *halvings >= HALVINGS[0])
}

fn at_setting(asking: &mut Asking<'_>, rtol: f64, dt_s: Option<f64>) -> Option<Cause> {
    let of_depth = |depth| Problem::of_stages(1.0, 100.0, [Stage::tunnel(500.0, 0.5)]).with_exit(depth);
    // One absolute tolerance, or else each flight has steps of its own.
    let atol = PeerRequest::from_problem(&of_depth(1.0), rtol).atol;
    let (mut times, mut times_found) = (Vec::with_capacity(EXITS), Vec::with_capacity(EXITS));
    let mut off = [const { Vec::new() }; 3];
    for index in 0..EXITS {
        let [first, last] = DEPTHS;
        let problem = of_depth(first + (last - first) * index as f64 / (EXITS - 1) as f64);
        let request = PeerRequest { atol, dt_s, ..PeerRequest::from_problem(&problem, rtol) };
        let [found, exact] = ends(asking, &problem, &request)?;
        times.push(exact.time);
        times_found.push(found.time);
        let errors = errors(found, exact, problem.impact_speed);
        (0..3).for_each(|i| off[i].push(errors[i]));
    }
    if let Some(halvings) = dt_s.and_then(|step| halvings(&times_found, step)) {
        let statement = format!(
            "every exit lies at a whole number of parts of a step, each 2^-{halvings} of it: a step is halved {halvings} times to find it, and \
             no more"
        );
        return Some(Cause::plain("event-loose", statement, Certainty::Certain, EXITS, EXITS));
    }
    // A velocity at the wrong time is wrong by that: the time first.
    [1, 2].into_iter().find_map(|which| {
        let errors = &off[which];
        let (all, largest) = (lobes(errors), errors.iter().copied().fold(0.0, |most, error| f64::max(most, error.abs())));
        // The law is one all the way, and so is the sign: that of no other error is.
        let all_of = |sign: f64| {
            let is_one = |lobe: &&Lobe| lobe.is_one(errors) && errors[lobe.peak(errors)] * sign > 0.0;
            all.iter().filter(is_one).collect::<Vec<&Lobe>>()
        };
        let (late, early) = (all_of(1.0), all_of(-1.0));
        let seen = if late.len() > early.len() { late } else { early };
        let is_shown = seen.len() >= STEPS && seen.len() as f64 >= STEPS_PART * all.len() as f64;
        if !is_shown || dt_s.is_none() && largest <= 0.01 * ALLOWED * rtol {
            return None;
        }
        let place = |lobe: &&Lobe| {
            let [from, to, peak] = [lobe.from, lobe.to, lobe.peak(errors)].map(|i| times[i]);
            (peak - from) / (to - from)
        };
        let mut places: Vec<f64> = seen.iter().map(place).collect();
        places.sort_by(f64::total_cmp);
        let middle = places[places.len() / 2];
        let setting = dt_s.map_or_else(|| format!("a tolerance of {rtol:.0e}"), |step| format!("steps of {step:.1e} s"));
        let interpolated = "events are interpolated, less accurately than steps are taken";
        let (place, why) = match middle {
            ALMOST_WHOLE.. => {
                (", most of all in front of those", "the step that is shortened to land on an end is of a lower order than the others, or the interpolant of a step does not end where the step does")
            }
            _ if middle < 0.5 - OFF_MIDDLE => {
                (", most in the first half of the step, as with a wrong slope at its start", interpolated)
            }
            _ if middle > 0.5 + OFF_MIDDLE => {
                (", most in the second half of the step, as with a wrong slope at its end", interpolated)
            }
            _ => ("", interpolated),
        };
        let statement = format!(
            "the {} at an exit is right at the ends of steps and off by up to {largest:.0e} between them at {setting}{place}: {why}",
            QUANTITIES[which]
        );
        Some(Cause::plain("event-interpolated", statement, Certainty::Likely, EXITS, EXITS))
    })
}
