//! Ends of stages on a condition g(x, V) = 0: docs/enclosures.md, section 5.
//!
//! g keeps its sign through a panel of a step if its values over a box around the panel have it; or if g changes in one direction
//! there and has the sign at the end that is nearer to a zero. The first zero is a mean value over a tiny box.

use std::cell::Cell;

use smallvec::SmallVec;

use super::law::{Expression, sides_of};
use super::{Centre, PANELS_MAX, Series, is_before, is_decimal};
use crate::physics::ball::{Ball, UP};
use crate::physics::condition::Condition;
use crate::physics::expression::{Bound, Jets};
use crate::physics::{Scalar, State};

/// Parts of a step in which the sign of g is looked at for a guess, and halvings of one.
const PARTS: i32 = 16;
const HALVINGS: u32 = 60;

/// Panels that are looked at in a stage.
const LOOKS_MAX: u32 = 20_000;

/// Share of a time over which the slope of g is guessed.
const NEAR: f64 = 1e-6;

/// The condition that ends a stage.
pub(super) struct Ending<'a> {
    condition: &'a Condition<Ball>,
    g: Bound<Ball>,
    /// The sign of g where the stage begins.
    side: f64,
    /// Panels that may still be looked at in the stage.
    left: Cell<u32>,
}

/// Whether `condition` is met in a state at which its stage begins; `None` where that is open.
pub(super) fn is_met(condition: &Condition<Ball>, at: State<Ball>) -> Option<bool> {
    // Two decimals that are one number leave their difference open.
    let is_its_speed = condition.speed() == Some(at.velocity) && is_decimal(at.velocity);
    if is_its_speed { Some(true) } else { is_met_by(condition, condition.bound().eval(at.depth, at.velocity)) }
}

/// The same where the value is `g`.
fn is_met_by(condition: &Condition<Ball>, g: Ball) -> Option<bool> {
    if g.lower() > 0.0 {
        Some(false)
    } else if condition.has_two_sides() {
        if g.is_zero() { Some(true) } else { (g.upper() < 0.0).then_some(false) }
    } else {
        (g.upper() <= 0.0).then_some(true)
    }
}

impl<'a> Ending<'a> {
    /// The `condition` of a stage that begins in a state; `None` where it is not proved to be open there.
    pub(super) fn new(condition: &'a Condition<Ball>, at: State<Ball>) -> Option<Self> {
        let g = condition.bound();
        let first = g.eval(at.depth, at.velocity);
        let side = if first.lower() > 0.0 { 1.0 } else { -1.0 };
        let is_ahead = is_met(condition, at) == Some(false);
        is_ahead.then(|| Self { condition, g, side, left: Cell::new(LOOKS_MAX) })
    }

    /// g at all depths in `x` and velocities in `v`, above zero where the stage begins.
    fn value(&self, x: Ball, v: Ball) -> Ball {
        self.g.eval(x, v).scaled(self.side)
    }

    /// Whether g keeps its sign in a box.
    pub(super) fn is_clear(&self, x: Ball, v: Ball) -> bool {
        self.value(x, v).lower() > 0.0
    }

    /// Its slope over time in a box, on paths with a deceleration in `a`; `None` where a switch of g is open.
    fn slope(&self, x: Ball, v: Ball, a: Ball) -> Option<Ball> {
        let sides = sides_of(&self.g, x, v)?;
        let mut jets = Jets::default();
        jets.start(&self.g, &sides);
        jets.push(&self.g, x, v);
        Some(jets.push(&self.g, v, -a).scaled(self.side))
    }

    /// Whether g keeps its sign from 0 to `time` on all paths with x' > 0 that differ from the polynomials by no more than `depth`
    /// (m) and `velocity` (m/s).
    pub(super) fn stays_open(
        &self,
        law: &Expression<'_>,
        (centre, series): (&Centre, &Series),
        time: f64,
        (depth, velocity): (f64, f64),
    ) -> bool {
        let sizes = series.sizes(time);
        let length = series.velocity * series.time;
        let steepest: f64 = (1..).zip(&sizes.v[1..]).map(|(k, size)| f64::from(k) * size).sum::<f64>() / time * UP;
        let state = |time: f64| {
            let ([v, x], [of_v, of_x]) = series.at(time, &sizes);
            let x = Ball::around(centre.x, 0.0) + Ball::around(x.scaled(length), (length * of_x + depth) * UP);
            (x, Ball::around(v.scaled(series.velocity), (series.velocity * of_v + velocity) * UP))
        };
        let mut waiting = SmallVec::<[(f64, f64); 64]>::new();
        waiting.push((0.0, time));
        let mut count = 0;
        while let Some((from, to)) = waiting.pop() {
            count += 1;
            let middle = 0.5 * (from + to);
            let (start, end) = (state(from), state(to));
            let x = start.0.hull(end.0);
            let v = state(middle).1.widened(0.5 * (to - from) * steepest * series.velocity * UP);
            if self.is_clear(x, v) {
                continue;
            }
            let slope = self.slope(x, v, law.deceleration(x, v));
            let nearest = slope.and_then(|slope| match slope {
                falls if falls.upper() < 0.0 => Some(end),
                rises if rises.lower() > 0.0 => Some(start),
                _ => None,
            });
            if nearest.is_some_and(|(x, v)| self.is_clear(x, v)) {
                continue;
            }
            self.left.set(self.left.get().saturating_sub(1));
            if count > PANELS_MAX || self.left.get() == 0 || middle <= from || middle >= to {
                return false;
            }
            waiting.extend([(middle, to), (from, middle)]);
        }
        true
    }

    /// About how long before and behind `time`, near which g vanishes, its numbers leave its sign open.
    pub(super) fn uncertainty(&self, centre: &Centre, series: &Series, time: f64) -> f64 {
        let place = |time: f64| {
            let [v, _, x] = series.near(time);
            (centre.x.hi + x * series.velocity * series.time, v * series.velocity)
        };
        let ((x, v), (x_before, v_before)) = (place(time), place(time * (1.0 - NEAR)));
        let falls = self.side * (self.condition.value(x_before, v_before) - self.condition.value(x, v));
        let open = 2.0 * self.value(Ball::from_f64(x), Ball::from_f64(v)).radius * NEAR * time / falls;
        if open.is_finite() && open > 0.0 { open } else { 0.0 }
    }

    /// A time near which g first changes its sign on the polynomials, if it is seen to do so until `span`.
    pub(super) fn root(&self, centre: &Centre, series: &Series, span: f64) -> Option<f64> {
        let is_met = |time: f64| {
            let [v, _, x] = series.near(time);
            let x = centre.x.hi + x * series.velocity * series.time;
            self.side * self.condition.value(x, v * series.velocity) <= 0.0
        };
        let part = |n: i32| span * f64::from(n) / f64::from(PARTS);
        let first = (1..=PARTS).find(|n| is_met(part(*n)))?;
        let (mut low, mut high) = (part(first - 1), part(first));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if is_met(middle) { high = middle } else { low = middle }
        }
        Some(high)
    }

    /// The state in which g first vanishes, from one next to it: `T = g/|g'|` with a mean slope. `None` where that is not proved, or
    /// not before `limit`.
    pub(super) fn met(&self, law: &Expression<'_>, before: &Centre, limit: Ball) -> Option<State<Ball>> {
        let (x, v) = (before.depth(), before.velocity());
        let g = self.value(x, v);
        let falls = |x, v, a| Some(-self.slope(x, v, a)?).filter(|slope| slope.lower() > 0.0);
        let reach = 4.0 * (g / falls(x, v, law.deceleration(x, v))?).upper();
        let (depths, speeds, a) = law.spread(before, reach)?;
        let time = g / falls(depths, speeds, a)?;
        if !(g.lower() > 0.0 && time.upper() <= reach && is_before(depths, limit)) {
            return None;
        }
        let depth = x + v * time - (a * time * time).scaled(0.5);
        Some(self.condition.at_end(State { time: before.time + time, depth, velocity: v - a * time }))
    }
}
