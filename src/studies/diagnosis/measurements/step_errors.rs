//! With which power of its size does the error of one step grow? Under each term of the force alone, and under two of them.
//!
//! A step of a scheme of order k has an error of the power k + 1. Where one term alone lowers it, so does what the scheme makes of
//! this term; where each is right and two together are not, they are applied one after the other.
//!
//! A scheme that linearises the force has the order of its first step later on only where it does so anew in each.
//!
//! Source: Hairer, Lubich, Wanner (2006), Geometric Numerical Integration, section II.5.

use super::super::Asking;
use super::super::causes::{Cause, Certainty};
use super::one_step::landed;
use super::several_steps::{BEHIND, state_at};
use crate::physics::{Problem, Stage};

/// Times of steps (s), the longest first.
const SIZES: [f64; 4] = [0.08, 0.03, 0.01, 0.004];
/// By how much a power may differ from an integer, and errors of V that are round-off.
const NEAR: f64 = 0.2;
const ROUND_OFF: f64 = 1e-14;
/// Below this part of the size to its power an error is that of a number with too few digits.
const SMALL: f64 = 1e-3;

/// Time (s) at which a later step starts, its sizes (s), the second half the first, and by how much two values of V there may differ, over
/// the square of the size.
const LATER: f64 = 1.0;
const LATER_SIZES: [f64; 2] = [0.05, 0.025];
const ONE_STATE: f64 = 1e-3;
/// How near to the end of a step its state is asked for, over [`BEHIND`].
const NEARER: f64 = 0.1;

/// The flight of 1 kg from 1 m/s: p, s, r and q of its force (SI), its velocity (m/s) and its depth (m) after a time (s), and what is
/// wrong where its errors alone have a lower power.
struct Motion {
    terms: [f64; 4],
    velocity: fn(f64) -> f64,
    depth: fn(f64) -> f64,
    said: &'static str,
}

/// Each term alone, and then two.
static MOTIONS: [Motion; 5] = [
    Motion {
        terms: [0.0, 0.0, 1.0, 0.0],
        velocity: |t| (-t).exp(),
        depth: |t| -(-t).exp_m1(),
        said: "viscosity alone, V' = -V",
    },
    Motion {
        terms: [0.0, 0.0, 0.0, 1.0],
        velocity: |t| 1.0 / (1.0 + t),
        depth: f64::ln_1p,
        said: "drag alone, V' = -V²: V² in the force is that of another time, or a derivative of it is wrong, as in a Jacobian",
    },
    Motion { terms: [0.0, 1.0, 0.0, 0.0], velocity: f64::cos, depth: f64::sin, said: "stiffness alone, V' = -x" },
    Motion {
        terms: [1.0, 0.0, 1.0, 0.0],
        velocity: |t| 2.0 * (-t).exp() - 1.0,
        depth: |t| -2.0 * (-t).exp_m1() - t,
        said: "a static force and viscosity, V' = -1 - V: each is applied by itself, one after the other",
    },
    Motion {
        terms: [1.0, 0.0, 0.0, 1.0],
        velocity: |t| (std::f64::consts::FRAC_PI_4 - t).tan(),
        depth: |t| ((std::f64::consts::FRAC_PI_4 - t).cos() * std::f64::consts::SQRT_2).ln(),
        said: "a static force and drag, V' = -1 - V²: each is applied by itself, one after the other",
    },
];

/// The power of an error, and the factor before it, per second to this power; infinite where there is none.
fn power(asking: &mut Asking<'_>, motion: &Motion) -> Option<(f64, f64)> {
    let [static_force, stiffness, viscosity, drag] = motion.terms;
    let law = Stage { static_force, stiffness, viscosity, drag, ..Stage::free() };
    let mut error = |size: f64| {
        let end = landed(asking, &Problem::of_stages(1.0, 1.0, [law]).with_exit((motion.depth)(size)), 0.0)?;
        Some((end.time, end.velocity - (motion.velocity)(end.time)))
    };
    let errors: Vec<(f64, f64)> = SIZES.into_iter().map(&mut error).collect::<Option<_>>()?;
    // Of the shortest steps whose errors are seen.
    let Some(shortest) = (1..errors.len()).rfind(|index| errors[*index].1.abs() > ROUND_OFF) else {
        return Some((f64::INFINITY, 0.0));
    };
    let [(long, of_long), (short, of_short)] = [errors[shortest - 1], errors[shortest]];
    let found = (of_long / of_short).abs().ln() / (long / short).ln();
    let whole = found.round();
    ((found - whole).abs() <= NEAR).then(|| (whole, of_short / short.powf(whole)))
}

/// The power of the error of the step under drag alone that starts at a time (s).
fn power_under_drag(asking: &mut Asking<'_>, start: f64) -> Option<f64> {
    let law = Stage { drag: 1.0, ..Stage::free() };
    let problem = Problem::of_stages(1.0, 1.0, [law]);
    // V at a time, from exits a little behind it, by the right flight.
    let mut velocity = |time: f64, size: f64| {
        if time == 0.0 {
            return Some(problem.impact_speed);
        }
        let [one, other] = BEHIND.map(|part| {
            let late = NEARER * part * size;
            let found = state_at(asking, &problem, [size, time + late, (time + late).ln_1p()])?;
            Some(1.0 / (1.0 / found.velocity - late))
        });
        let (one, other) = (one?, other?);
        ((one - other).abs() <= ONE_STATE * size * size).then_some(one)
    };
    let [coarse, fine] = LATER_SIZES.map(|size| {
        let (before, behind) = (velocity(start, size)?, velocity(start + size, size)?);
        Some(behind - 1.0 / (1.0 / before + size))
    });
    let power = (coarse? / fine?).abs().log2();
    ((power - power.round()).abs() <= NEAR).then_some(power.round())
}

/// The first motion under which a step has a lower order than `claimed`, where the ones before it do not.
pub(super) fn measured(asking: &mut Asking<'_>, claimed: f64) -> Option<Cause> {
    for (right, motion) in MOTIONS.iter().enumerate() {
        let (power, factor) = power(asking, motion)?;
        if power > claimed {
            continue;
        }
        let few_digits =
            if factor.abs() < SMALL { ": so small an error is as that of a number with too few digits" } else { "" };
        let statement = format!(
            "one step of a time h has an error of {factor:.3e} h^{power} in V, and so the order {} in place of {claimed}, under {}{few_digits}",
            power - 1.0,
            motion.said
        );
        let asked = SIZES.len() * (right + 1);
        return Some(Cause::plain("scheme-coefficient", statement, Certainty::Likely, asked, asked));
    }
    None
}

/// Whether steps under drag alone have a lower order later than at impact, where they do not under viscosity.
pub(super) fn later(asking: &mut Asking<'_>, claimed: f64) -> Option<Cause> {
    let [first, later] = [0.0, LATER].map(|start| power_under_drag(asking, start));
    let later = later.filter(|power| *power <= claimed && first.is_some_and(|first| first > claimed))?;
    let statement = format!(
        "under drag alone the first step has the order {claimed}, and later ones {}: what a step takes from the drag, such as a linear part, \
         is that of the start of the stage",
        later - 1.0
    );
    let asked = 3 * BEHIND.len() * LATER_SIZES.len();
    Some(Cause::plain("drag-lagged", statement, Certainty::Likely, asked, asked))
}
