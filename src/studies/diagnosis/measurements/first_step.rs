//! What does an adaptive scheme make of its first step? An exit within it shows that, where the step is shortened to land there.
//!
//! Of one step the velocity is a power series of the time: under `V' = -V` its coefficients are `1/k!` up to the order of the
//! scheme, under drag alone, `V' = -V²`, they are all one, under stiffness alone, `V' = -x`, they are those of the cosine. How
//! long the first step is nobody says, so that ever shorter exits are asked for until a few of them lie on one polynomial, and that
//! must be the same with other tolerances, or else it is the interpolant of a longer step.
//!
//! Source: Hairer, Nørsett, Wanner (1993), Solving Ordinary Differential Equations I, section II.1; Jorba, Zou (2005), A software
//! package for the numerical integration of ODEs by means of high-order Taylor methods, Experimental Mathematics 14.

use nalgebra::{SMatrix, SVector};

use super::super::causes::{Cause, Certainty};
use super::super::{ALLOWED, Asking, TOLERANCES};
use super::ends;
use super::one_step::{ANOTHER, COEFFICIENTS, FORETOLD, SAME, SIZES};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage, State};

/// Factors of the sizes, and how many coefficients are known to [`ANOTHER`] with each: longer exits leave out too much of the series,
/// and in shorter ones the last digits are lost.
const SCALES: [(f64, usize); 3] = [(0.1, 4), (0.03, 3), (0.003, 2)];
/// A coefficient below which only its absolute error counts.
const LEAST: f64 = 0.03;
/// Depth (m) at which V shows whether a force is another one.
const BRAKED: f64 = 0.03;
/// Relative tolerances with the depth (m) that scales the absolute one.
const SETTINGS: [(f64, f64); 2] = [(TOLERANCES[0], 1.0), (TOLERANCES[1], 0.3)];

/// A flight from 1 m/s of 1 kg through a stage, of which one number is a power series of the time.
struct Motion {
    stage: Stage,
    /// Depth (m) after a time (s).
    depth: fn(f64) -> f64,
    /// What is one at impact.
    value: fn(State) -> f64,
}

fn velocity(state: State) -> f64 {
    state.velocity
}

impl Motion {
    /// Coefficients c1, c2 ... of `1 + c1 (-t) + c2 (-t)² + ...` with the number of those that are known.
    fn coefficients(&self, asking: &mut Asking<'_>) -> Option<([f64; COEFFICIENTS], usize)> {
        SCALES.into_iter().find_map(|(scale, known)| {
            let [one, other] = SETTINGS.map(|setting| self.fitted(asking, scale, setting));
            let (one, other) = (one?, other?);
            let is_one = |k: usize| (one[k] - other[k]).abs() <= 0.1 * ANOTHER * one[k].abs().max(LEAST);
            (0..known).all(is_one).then(|| (std::array::from_fn(|k| one[k]), known))
        })
    }

    /// The same by one setting, if another point lies on the polynomial.
    fn fitted(
        &self,
        asking: &mut Asking<'_>,
        scale: f64,
        (rtol, length): (f64, f64),
    ) -> Option<SVector<f64, COEFFICIENTS>> {
        let mut point = |size: f64| {
            let problem = Problem::of_stages(1.0, 1.0, [self.stage]).with_exit((self.depth)(scale * size));
            let request = PeerRequest { atol: [rtol * length, rtol], ..PeerRequest::from_problem(&problem, rtol) };
            let [found, _] = ends(asking, &problem, &request)?;
            (found.time > 0.0).then(|| (-found.time / scale, ((self.value)(found) - 1.0) / -found.time))
        };
        let points: Vec<(f64, f64)> = SIZES.into_iter().map(&mut point).collect::<Option<_>>()?;
        let powers =
            SMatrix::<f64, COEFFICIENTS, COEFFICIENTS>::from_fn(|row, column| points[row].0.powi(column as i32));
        let values = SVector::<f64, COEFFICIENTS>::from_fn(|row, _| points[row].1);
        let found = powers.lu().solve(&values)?;
        let (z, value) = point(FORETOLD)?;
        let foretold: f64 = found.iter().rev().fold(0.0, |sum, coefficient| sum * z + coefficient);
        let is_on_it = (foretold - value).abs() <= SAME * SAME.sqrt();
        is_on_it.then(|| SVector::from_fn(|k, _| found[k] / scale.powi(k as i32)))
    }
}

/// Whether a flight to rest ends at its depth.
fn rests_rightly(asking: &mut Asking<'_>, stage: Stage) -> bool {
    let problem = Problem::of_stages(1.0, 1.0, [stage]);
    let request = PeerRequest::from_problem(&problem, TOLERANCES[1]);
    ends(asking, &problem, &request)
        .is_some_and(|[found, exact]| (found.depth - exact.depth).abs() <= ALLOWED * request.rtol * exact.depth)
}

/// Whether the coefficient `found` is another one than `right`.
fn is_another(found: f64, right: f64) -> bool {
    (found - right).abs() > ANOTHER * right
}

/// What the first step shows, where it is not what its order asks for.
pub(super) fn measured(asking: &mut Asking<'_>) -> Option<Cause> {
    let asked = SETTINGS.len() * (SIZES.len() + 1);
    let likely = |factor: f64, statement: String| {
        Some(Cause {
            factor: Some(factor),
            ..Cause::plain("scheme-coefficient", statement, Certainty::Likely, asked, asked)
        })
    };
    let steady = Stage::tunnel(1.0, 0.0);
    let constant = |value| Motion { stage: steady, depth: |t| t - 0.5 * t * t, value };
    // A velocity that is wrong there is that of another force, or of another time: no scheme makes it so.
    let ([first, second, ..], _) = constant(velocity).coefficients(asking)?;
    if is_another(first, 1.0) {
        return None;
    }
    if second.abs() > ANOTHER {
        // Where V is right at its depth, the time alone is wrong.
        let problem = Problem::of_stages(1.0, 1.0, [steady]).with_exit(BRAKED);
        let [found, exact] = ends(asking, &problem, &PeerRequest::from_problem(&problem, TOLERANCES[0]))?;
        if (found.velocity - exact.velocity).abs() <= ANOTHER * BRAKED * BRAKED {
            return None;
        }
        let statement = format!(
            "the first step under a constant deceleration a has a term {second:.6} (a t)²/V0 in V, where there is none: a series with a \
             term too many, or a force that does not stay the same"
        );
        return Some(Cause::plain("scheme-coefficient", statement, Certainty::Likely, asked, asked));
    }
    let ([first, ..], _) = constant(|state| state.depth / state.time).coefficients(asking)?;
    // One that is right at rest has another depth at the exit alone.
    if is_another(first, 0.5) && !rests_rightly(asking, steady) {
        let statement =
            format!("the first step under a constant deceleration a has a h² in x with a factor {first:.6}, not 0.5");
        return likely(2.0 * first, statement);
    }
    let viscous = Stage { viscosity: 1.0, ..Stage::free() };
    let (of_viscosity, known) =
        Motion { stage: viscous, depth: |t| 1.0 - (-t).exp(), value: velocity }.coefficients(asking)?;
    if is_another(of_viscosity[0], 1.0) {
        return None;
    }
    if let Some((power, [found, right])) = wrong_power(&of_viscosity[..known]) {
        let statement = format!(
            "the first step under V' = z V/h gives V the term {found:.6} z^{power}, where order {power} has {right:.6} z^{power}"
        );
        return likely(found / right, statement);
    }
    let spring = Stage { stiffness: 1.0, ..Stage::free() };
    let (of_stiffness, known_here) = Motion { stage: spring, depth: f64::sin, value: velocity }.coefficients(asking)?;
    let of_cosine = [0.0, -0.5, 0.0, 1.0 / 24.0];
    let order = right_terms(&of_viscosity[..known]).min(known_here).max(2);
    let is_off = |k: &usize| (of_stiffness[*k] - of_cosine[*k]).abs() > ANOTHER;
    if let Some(index) = (0..order.min(of_cosine.len())).find(is_off) {
        // Adding zero makes 0 of -0.
        let found = (1e6 * of_stiffness[index]).round() / 1e6 + 0.0;
        let (right, power) = (of_cosine[index], index + 1);
        let statement = format!(
            "the first step under stiffness alone, V' = -z² x/h², gives V the term {found:.6} (-z)^{power}, where order {power} has \
             {right:.6} (-z)^{power}, and without stiffness it is right: the x in the force is that of another time, or another term of its \
             series"
        );
        return Some(Cause::plain("scheme-coefficient", statement, Certainty::Likely, asked, asked));
    }
    let dragged = Stage { drag: 1.0, ..Stage::free() };
    let (of_drag, known_too) = Motion { stage: dragged, depth: f64::ln_1p, value: velocity }.coefficients(asking)?;
    // Where the term of one power more is right without drag, the scheme is of that order.
    let order = right_terms(&of_viscosity[..known]).saturating_sub(1).max(2);
    let index = (0..order.min(known_too)).find(|k| is_another(of_drag[*k], 1.0)).filter(|k| *k > 0)?;
    let (found, power) = (of_drag[index], index + 1);
    let statement = format!(
        "the first step under drag alone, V' = z V²/(V0 h), gives V the term {found:.6} z^{power}, where order {power} has 1 z^{power}, \
         and under V' = z V/h it is right{}",
        product(&of_drag[..known_too]).map_or_else(String::new, |said| format!(": {said}"))
    );
    likely(found, statement)
}

/// Coefficients from the first on that are `1/k!`.
fn right_terms(found: &[f64]) -> usize {
    let mut right = 1.0;
    let is_right = |(index, found): (usize, &f64)| {
        right /= (index + 1) as f64;
        !is_another(*found, right)
    };
    found.iter().enumerate().map(is_right).take_while(|is| *is).count()
}

/// The first coefficient that is not `1/k!`, with its power and the right one: of a power that every scheme must have, or of one
/// behind which those follow each other as they should, so that no end of the order is there.
fn wrong_power(found: &[f64]) -> Option<(usize, [f64; 2])> {
    let index = right_terms(found);
    let right = (1..=index + 1).fold(1.0, |product, k| product / k as f64);
    let wrong = *found.get(index)?;
    let follow = |k: usize| !is_another(found[k] * (k + 1) as f64 / found[k - 1], 1.0);
    let are_right_behind = (index + 1..found.len()).any(|k| {
        let own = (1..=k + 1).fold(1.0, |product, k| product / k as f64);
        follow(k) || !is_another(found[k], own)
    });
    (index < 2 || are_right_behind).then_some((index + 1, [wrong, right]))
}

/// What a product of series lacks that gives V these coefficients under drag.
fn product(found: &[f64]) -> Option<String> {
    // The term k of V², from those of V so far.
    let last_left_out: fn(&[f64]) -> f64 = |v| (0..v.len().max(2) - 1).map(|i| v[i] * v[v.len() - 1 - i]).sum();
    let ends_alone: fn(&[f64]) -> f64 = |v| if v.len() == 1 { v[0] * v[0] } else { 2.0 * v[0] * v[v.len() - 1] };
    let middle_left_out: fn(&[f64]) -> f64 = |v| {
        let half: f64 = (0..v.len() / 2).map(|i| v[i] * v[v.len() - 1 - i]).sum();
        if v.len() == 1 { v[0] * v[0] } else { 2.0 * half }
    };
    let counted_once: fn(&[f64]) -> f64 = |v| (0..v.len().div_ceil(2)).map(|i| v[i] * v[v.len() - 1 - i]).sum();
    let said = [
        (last_left_out, "without its first or last term"),
        (ends_alone, "without its terms in the middle"),
        (middle_left_out, "without the term in the middle, the square"),
        (counted_once, "of which each pair of terms counts once"),
    ]
    .into_iter()
    .filter(|(term, _)| {
        let mut series = vec![1.0];
        while series.len() <= found.len() {
            let next = term(&series) / series.len() as f64;
            series.push(next);
        }
        series[1..].iter().zip(found).all(|(made, found)| !is_another(*found, *made))
    })
    .map(|(_, said)| said)
    .collect::<Vec<_>>();
    (!said.is_empty()).then(|| format!("as of a series of V² {}", said.join(", or ")))
}
