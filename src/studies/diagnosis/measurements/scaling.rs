//! How does each term of the force grow with the numbers of a question? One that is made dimensionless by another mass, length or speed
//! than the others has powers of them as a factor.

use super::super::causes::{Cause, Certainty};
use super::super::questions::Question;
use super::super::{Asking, Diagnosis, TOLERANCES};
use super::ends;
use super::stage_by_stage::{OF_TERM, terms};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage};
use crate::studies::verdict::Verdict;

/// Parts of V that a flight loses rightly, of which the first is taken whose flight shows a loss within [`SEEN`].
const LOSSES: [f64; 3] = [1e-3, 1e-6, 0.1];
const SEEN: [f64; 2] = [1e-8, 0.5];
/// By how much a power differs from the half of an integer, and a factor from another one: V is another along the flight.
const NEAR: f64 = 0.01;

/// The numbers of a flight through one term up to an exit: M (kg), V0 (m/s), the depth L of the exit (m) and the coefficient (SI).
type Numbers = [f64; 4];

/// M, V0 and L of two flights that have nothing in common.
const FLIGHTS: [[f64; 3]; 2] = [[1.7, 83.0, 0.6], [0.4, 310.0, 2.3]];

/// The coefficient of a `term` that takes the part `loss` of V.
fn coefficient(term: usize, [mass, speed, depth]: [f64; 3], loss: f64) -> f64 {
    // V1/V0 is 1 - loss: from the energy, from the momentum, and from the exponential.
    let of_energy = mass * speed * speed * loss * (2.0 - loss);
    match term {
        0 => of_energy / (2.0 * depth),
        1 => of_energy / (depth * depth),
        2 => mass * speed * loss / depth,
        _ => -(-loss).ln_1p() * mass / depth,
    }
}

/// The coefficient that the solver has over that of the question; `None` where the flight does not show it.
fn factor(asking: &mut Asking<'_>, term: usize, [mass, speed, depth, own]: Numbers) -> Option<f64> {
    let [static_force, stiffness, viscosity, drag] = std::array::from_fn(|at| if at == term { own } else { 0.0 });
    let law = Stage { static_force, stiffness, viscosity, drag, ..Stage::free() };
    let problem = Problem::of_stages(mass, speed, [law]).with_exit(depth);
    let [found, _] = ends(asking, &problem, &PeerRequest::from_problem(&problem, TOLERANCES[2]))?;
    let loss = 1.0 - found.velocity / speed;
    (SEEN[0]..=SEEN[1]).contains(&loss).then(|| coefficient(term, [mass, speed, depth], loss) / own)
}

/// The powers of its numbers that a `term` has as a factor, and the number before them.
fn powers(asking: &mut Asking<'_>, term: usize) -> Option<([f64; 4], f64)> {
    let mut of_flight = |flight: [f64; 3]| {
        let [mass, speed, depth] = flight;
        let of_loss = |loss| {
            let numbers = [mass, speed, depth, coefficient(term, flight, loss)];
            Some((numbers, factor(asking, term, numbers)?))
        };
        let (numbers, here) = LOSSES.into_iter().find_map(of_loss)?;
        let mut found = [0.0; 4];
        for (which, power) in found.iter_mut().enumerate() {
            let mut doubled = numbers;
            doubled[which] *= 2.0;
            let exact = (factor(asking, term, doubled)? / here).log2();
            *power = 0.5 * (2.0 * exact).round();
            if !((exact - *power).abs() <= NEAR) {
                return None;
            }
        }
        let of_numbers: f64 = numbers.into_iter().zip(found).map(|(number, power)| number.powf(power)).product();
        Some((found, here / of_numbers))
    };
    let [first, second] = FLIGHTS.map(&mut of_flight);
    let (one, two) = (first?, second?);
    (one.0 == two.0 && (two.1 / one.1 - 1.0).abs() <= NEAR).then_some(one)
}

/// The one term that has a factor of powers.
pub(super) fn measured(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<Cause> {
    let mut scaled = Vec::new();
    for term in 0..OF_TERM.len() {
        // One that is not understood may be any.
        let (powers, before) = powers(asking, term)?;
        if powers != [0.0; 4] {
            scaled.push((term, powers, before));
        }
    }
    let [(term, powers, before)] = scaled[..] else { return None };
    let failing = found.questions.iter().filter(|row| row.verdict == Verdict::Failed);
    let holds = |question: &Question| question.problem.stages.iter().any(|law| terms(law)[term]);
    let explained = failing.filter(|row| all.iter().any(|question| question.id == row.id && holds(question))).count();
    let (id, what) = OF_TERM[term];
    let symbol = what.rsplit(' ').next().unwrap_or(what);
    let named = ["M", "V0", "L", symbol].into_iter().zip(powers).filter(|(_, power)| *power != 0.0);
    let product: Vec<String> =
        named.map(|(name, power)| if power == 1.0 { name.to_owned() } else { format!("{name}^{power}") }).collect();
    let statement = format!(
        "alone, up to an exit at L, {what} acts as {before:.3} {symbol} {} in SI units: it is not made dimensionless as the others, or \
         depends on what it must not",
        product.join(" ")
    );
    let certainty = if 10 * explained >= 9 * found.counts.failed { Certainty::Likely } else { Certainty::Possible };
    Some(Cause::plain(id, statement, certainty, explained, found.counts.failed))
}
