//! Jumps of the force that are spread over a part of the way: over so many metres, a part of the depth at which they are, or of
//! the thickness of the stage before.

use super::super::simulation::Place;
use super::{Change, Hypothesis, Parameter, of};
use crate::physics::Stage;

/// What the width of a jump is counted in.
const METRES: u8 = 0;
const DEPTHS: u8 = 1;
const STAGES: u8 = 2;

/// The force of the first stage and every jump behind it, each by the `share` of its distance over its width.
fn spread<const UNIT: u8>(at: &Place<'_>, number: f64, share: fn(f64) -> f64) -> f64 {
    let force = |law: &Stage| law.force(at.depth, at.velocity);
    let mut sum = force(&at.problem.stages[0]);
    for (index, pair) in at.problem.stages.windows(2).enumerate() {
        let end = pair[0].end;
        let width = number
            * match UNIT {
                METRES => 1.0,
                DEPTHS => end,
                _ => end - at.problem.start_of(index),
            };
        // A stage without thickness has no room for it.
        let part = if width > 0.0 { share((at.depth - end) / width) } else { f64::from(u8::from(at.index > index)) };
        if part > 0.0 {
            sum += part * (force(&pair[1]) - force(&pair[0]));
        }
    }
    sum
}

/// Shares of a jump by the distance from it over its width.
fn behind(distance: f64) -> f64 {
    distance.clamp(0.0, 1.0)
}

fn before(distance: f64) -> f64 {
    (1.0 + distance).clamp(0.0, 1.0)
}

fn around(distance: f64) -> f64 {
    (0.5 + 0.5 * distance).clamp(0.0, 1.0)
}

fn around_smoothly(distance: f64) -> f64 {
    let part = around(distance);
    part * part * (3.0 - 2.0 * part)
}

fn as_tanh(distance: f64) -> f64 {
    0.5 + 0.5 * distance.tanh()
}

/// A share by one kind of width.
macro_rules! over {
    ($says:literal, $share:ident, $unit:ident, $parameter:expr, $width:literal) => {
        of(
            "force-smoothed",
            concat!("the jump of the force at each end of a stage is spread ", $says, $width),
            $parameter,
            &[Change::Force(|at, n| spread::<$unit>(at, n, $share))],
        )
    };
    (parts $says:literal, $share:ident) => {
        [
            over!($says, $share, DEPTHS, Parameter::Fraction, "{} times the depth of that end"),
            over!($says, $share, STAGES, Parameter::Fraction, "{} times the thickness of that stage"),
        ]
    };
}

/// Jumps that are spread over a part of the way.
pub(super) static PARTS: [[Hypothesis; 2]; 5] = [
    over!(parts "behind it, over ", behind),
    over!(parts "before and behind it, over ", around),
    over!(parts "before it, over ", before),
    over!(parts "before and behind it, by 3 u² - 2 u³, over ", around_smoothly),
    over!(parts "by tanh, with a width of ", as_tanh),
];

/// Jumps that are spread over a length, in other ways than along a straight line.
pub(super) static LENGTHS: [Hypothesis; 2] = [
    over!("before and behind it, by 3 u² - 2 u³, over ", around_smoothly, METRES, Parameter::Value(1e-3), "{} m"),
    over!("by tanh, with a width of ", as_tanh, METRES, Parameter::Value(1e-3), "{} m"),
];
