//! Steps through a law of one's own, an expression of x and V: docs/enclosures.md, section 5.
//!
//! The polynomials are those of any step. Their defect is that of the power series of the expression in balls, and its
//! rest the coefficient of order K anywhere on the path. Slopes of the force in a tube around the path bound what becomes of an error.

use smallvec::SmallVec;

use super::ending::Ending;
use super::{Centre, Defect, DoubleWord, Error, FINE, MAGNITUDES, ORDER, Series, Step, is_before};
use crate::physics::State;
use crate::physics::ball::{Ball, TINY, UP};
use crate::physics::expression::{Bound, Jets};
use crate::physics::scalar::{Scalar, reciprocal};

use super::super::taylor::power_of_two_below;

/// Share of the length of a step that its last coefficients allow: the rest is bounded with intervals, which give some away.
pub(super) const SHARE: f64 = 0.75;

/// What a step may add to the velocity, as a share of it: by truncation, and across a box.
const ADDED: f64 = 1.0 / (1_u128 << 62) as f64;

/// Least length of a step by a series, in units of its time: a kink so near is crossed in a box.
pub(super) const SPAN_MIN: f64 = 1.0 / (1_u64 << 30) as f64;

/// Share of the time of a flight that the box of its rest may leave open.
const OPEN_AT_REST: f64 = 1.0 / (1_u64 << 56) as f64;

/// Longest path of a box over the unit of time, and how often it is shortened by 16.
const BOX_MAX: f64 = 1.0 / 256.0;
const BOXES_MAX: u32 = 22;

/// Tubes tried around a step.
const TUBES_MAX: u32 = 4;

/// A force by expression, the mass that it slows, and what ends its stage besides a depth.
pub(super) struct Expression<'a> {
    force: &'a Bound<Ball>,
    mass: Ball,
    pub(super) ending: Option<Box<Ending<'a>>>,
}

/// The branch of each min, max and abs.
pub(super) type Sides = SmallVec<[bool; 4]>;

/// The sides of all switches of `expression`, if each is the same in all of the box.
pub(super) fn sides_of(expression: &Bound<Ball>, x: Ball, v: Ball) -> Option<Sides> {
    let side = |switch: &Ball| {
        let is_above = switch.lower() >= 0.0;
        (is_above || switch.upper() < 0.0).then_some(is_above)
    };
    expression.switch_values(x, v).iter().map(side).collect()
}

/// What the polynomials of a step miss of the equation of motion, order by order: bounds of the coefficients of dv and dx below
/// order K, in units of the step.
pub(super) struct Misses {
    sides: Sides,
    force: [f64; ORDER],
    path: [f64; ORDER + 1],
}

impl Misses {
    /// Bounds of the integrals of |dv|, without the orders from K on, and of |dx| from 0 to `time`.
    fn defects(&self, time: f64) -> [f64; 2] {
        let integral = |coefficients: &[f64]| {
            let mut sum = 0.0;
            for (k, coefficient) in coefficients.iter().enumerate().rev() {
                sum = sum * time + coefficient * reciprocal::<f64>(k + 1);
            }
            sum * time * UP + TINY
        };
        [integral(&self.force), integral(&self.path)]
    }
}

impl<'a> Expression<'a> {
    pub(super) fn new(force: &'a Bound<Ball>, mass: Ball, ending: Option<Box<Ending<'a>>>) -> Self {
        Self { force, mass, ending }
    }

    /// Whether no condition is met at any depth in `x` and velocity in `v`.
    pub(super) fn is_open(&self, x: Ball, v: Ball) -> bool {
        self.ending.as_ref().is_none_or(|ending| ending.is_clear(x, v))
    }

    /// Deceleration (m/s²) at every depth in `x` and every velocity in `v`, not negative.
    pub(super) fn deceleration(&self, x: Ball, v: Ball) -> Ball {
        self.force.eval(x, v) / self.mass
    }

    /// The sides of all switches, if each is the same in all of the box.
    fn sides(&self, x: Ball, v: Ball) -> Option<Sides> {
        sides_of(self.force, x, v)
    }

    /// Derivatives `F_x/M` (1/s²) and `F_V/M` (1/s) everywhere in the box, which lies on the `sides`.
    fn slopes(&self, x: Ball, v: Ball, sides: &Sides) -> [Ball; 2] {
        let along = |dx: f64, dv: f64| {
            let mut jets = Jets::default();
            jets.start(self.force, sides);
            jets.push(self.force, x, v);
            jets.push(self.force, Ball::from_f64(dx), Ball::from_f64(dv)) / self.mass
        };
        [along(1.0, 0.0), along(0.0, 1.0)]
    }

    /// The series from depth `x` and velocity `v`, both exact; `None` where the force has none.
    pub(super) fn series(&self, x: DoubleWord, v: DoubleWord, limit: f64) -> Option<Series> {
        let (start, speed) = (Ball::around(x, 0.0), Ball::around(v, 0.0));
        let sides = self.force.sides(start, speed);
        let [by_depth, by_velocity] = self.slopes(start, speed, &sides).map(Ball::magnitude);
        let force = self.deceleration(start, speed).magnitude();
        let mut rate = (force / v.hi).max(by_depth.sqrt()).max(by_velocity);
        if rate == 0.0 {
            rate = v.hi / (limit - x.hi).max(1e-100);
        }
        if !(rate > 0.0 && rate < f64::INFINITY) {
            return None;
        }
        let (time, velocity) = (power_of_two_below(1.0 / rate), power_of_two_below(v.hi));
        if ![time, velocity, time * velocity].iter().all(|unit| MAGNITUDES.contains(unit)) {
            return None;
        }
        let misses = Misses { sides: sides.clone(), force: [0.0; ORDER], path: [0.0; ORDER + 1] };
        let mut series = Series::empty(time, velocity, Defect::Misses(Box::new(misses)));
        self.fill(&mut series, start, v).then_some(series)
    }

    /// Coefficients of force (N) to those of v', in units of the step.
    fn per_mass(&self, series: &Series, force: Ball) -> Ball {
        -(force.scaled(series.time / series.velocity) / self.mass)
    }

    /// `v[k+1] = -a[k]/(k+1)`, `x[k+1] = v[k]/(k+1)`, with the coefficients a of F/M on these polynomials, and what rounding
    /// leaves. Says whether there are such.
    fn fill(&self, series: &mut Series, start: Ball, speed: DoubleWord) -> bool {
        let Defect::Misses(mut misses) = std::mem::replace(&mut series.defect, Defect::Coefficients([Ball::zero(); 4]))
        else {
            return false;
        };
        let mut jets = Jets::default();
        jets.start(self.force, &misses.sides);
        let length = series.velocity * series.time;
        let (mut v, mut x) = (speed.scaled(1.0 / series.velocity), start);
        series.fine[0] = v;
        series.coarse[0] = v.hi;
        for k in 0..=ORDER {
            let divisor = (k + 1) as f64;
            let here = Ball::around(v, 0.0);
            let next_x = if k < FINE { v.over(divisor) } else { DoubleWord::of(v.hi * reciprocal::<f64>(k + 1)) };
            misses.path[k] = (Ball::around(next_x, 0.0) * Ball::from_f64(divisor) - here).magnitude();
            series.coarse_depth[k + 1] = next_x.hi;
            if k < FINE {
                series.fine_depth[k + 1] = next_x;
            }
            if k == ORDER {
                break;
            }
            let slope = self.per_mass(series, jets.push(self.force, x, here.scaled(series.velocity)));
            if !(slope.magnitude() < f64::INFINITY) {
                return false;
            }
            let next = slope.mid.over(divisor);
            v = if k + 1 < FINE { next } else { DoubleWord::of(next.hi) };
            misses.force[k] = (Ball::around(v, 0.0) * Ball::from_f64(divisor) - slope).magnitude();
            series.coarse[k + 1] = v.hi;
            if k + 1 < FINE {
                series.fine[k + 1] = v;
            }
            x = Ball::around(next_x.scaled(length), 0.0);
        }
        series.defect = Defect::Misses(misses);
        true
    }

    /// Coefficients of x (m) and V (m/s) at every time from 0 to `time`: those of the middle, and how far they may be from
    /// there.
    fn everywhere(series: &Series, start: Ball, time: f64) -> [[Ball; ORDER + 2]; 2] {
        let middle = 0.5 * time;
        let fine =
            |words: &[DoubleWord], k: usize, coarse: f64| words.get(k).copied().unwrap_or(DoubleWord::of(coarse));
        let length = series.velocity * series.time;
        let of = |k: usize| Ball::around(fine(&series.fine, k, series.coarse.get(k).copied().unwrap_or(0.0)), 0.0);
        let v = std::array::from_fn(|k| of(k).scaled(series.velocity));
        let of = |k: usize| Ball::around(fine(&series.fine_depth, k, series.coarse_depth[k]), 0.0).scaled(length);
        let x = std::array::from_fn(|k| if k == 0 { start } else { of(k) });
        [x, v].map(|mut of: [Ball; ORDER + 2]| {
            shift(&mut of, |a, b| *a += b * Ball::from_f64(middle));
            let mut sizes = of.map(Ball::magnitude);
            let before = sizes;
            shift(&mut sizes, |a, b| *a += b * middle);
            // The sums round up by UP; what they began with is less than is taken off.
            std::array::from_fn(|k| of[k].widened((sizes[k] * UP - before[k]).max(0.0) + TINY))
        })
    }

    /// The error of the polynomials at `time`, and the greatest of V until then; `None` where no bound is proved.
    pub(super) fn error_after(&self, centre: &Centre, series: &Series, time: f64) -> Option<(Error, f64)> {
        let Defect::Misses(misses) = &series.defect else { return None };
        let start = Ball::around(centre.x, 0.0);
        let [x, v] = Self::everywhere(series, start, time);
        if self.sides(x[0], v[0])? != misses.sides {
            return None;
        }
        let mut jets = Jets::default();
        jets.start(self.force, &misses.sides);
        let mut rest = Ball::zero();
        for k in 0..=ORDER {
            rest = jets.push(self.force, x[k], v[k]);
        }
        let order = (0..=ORDER).fold(1.0, |power, _| power * time);
        let truncation = self.per_mass(series, rest).magnitude() * order * reciprocal::<f64>(ORDER + 1) * UP;
        let [force, path] = misses.defects(time);
        let speed = series.coarse[0];
        if !(truncation <= ADDED * speed + force) {
            return None;
        }
        let (force, path) = (series.velocity * (force + truncation) * UP, series.velocity * series.time * path * UP);
        let duration = series.time * time;
        // Errors stay in a tube as long as they are smaller than it by the slopes inside it.
        let mut tube = 4.0 * (centre.error.velocity + force) + TINY;
        for _ in 0..TUBES_MAX {
            let wide = 4.0 * (centre.error.depth + path + duration * tube) + TINY;
            let (all_x, all_v) = (x[0].widened(wide), v[0].widened(tube));
            if self.sides(all_x, all_v)? != misses.sides {
                return None;
            }
            let [by_depth, by_velocity] = self.slopes(all_x, all_v, &misses.sides);
            let (stiffness, damping) = (by_depth.magnitude(), by_velocity.lower());
            let growth = (-damping).max(0.0) * duration * UP;
            let growth = 1.0 + growth + growth * growth;
            let coupling = duration * stiffness * growth * UP;
            if !(growth <= 3.0 && coupling * duration <= 0.5) {
                return None;
            }
            let sum = growth * (centre.error.velocity + force) + coupling * (centre.error.depth + path);
            let greatest = sum / (1.0 - coupling * duration * UP) * UP;
            let depth = (centre.error.depth + path + duration * greatest) * UP;
            if greatest < tube && depth < wide {
                let velocity = if damping >= 0.0 {
                    let y = damping * duration / UP;
                    let left = centre.error.velocity * UP / (1.0 + y + 0.5 * y * y);
                    greatest.min((left + force + duration * stiffness * depth) * UP)
                } else {
                    greatest
                };
                let is_open = |ending: &Ending<'_>| {
                    ending.is_clear(all_x, all_v) || ending.stays_open(self, (centre, series), time, (depth, greatest))
                };
                let is_open = self.ending.as_deref().is_none_or(is_open);
                return is_open.then_some((Error { norm: velocity, velocity, depth }, greatest));
            }
            tube *= 16.0;
        }
        None
    }

    /// A time from 0 to `span` until which the path of `series` keeps to its sides, as far as a box around it shows.
    pub(super) fn until_kink(&self, centre: &Centre, series: &Series, span: f64) -> f64 {
        let Defect::Misses(misses) = &series.defect else { return span };
        if misses.sides.is_empty() {
            return span;
        }
        let place = |time: f64| {
            let [v, _, x] = series.near(time);
            (centre.x.hi + x * series.velocity * series.time, v * series.velocity)
        };
        let is_beyond = |time: f64| {
            let (x, v) = place(time);
            self.force.sides(Ball::from_f64(x), Ball::from_f64(v)) != misses.sides
        };
        let is_shown = |time: f64| {
            let (x, v) = place(time);
            let (depths, speeds) =
                (Ball::between(centre.x.hi, x), Ball::between(v.min(centre.v.hi), v.max(centre.v.hi)));
            self.sides(depths, speeds).is_some()
        };
        let part = |n: i32| span * f64::from(n) / 16.0;
        let mut until = span;
        if let Some(first) = (1..=16).find(|n| is_beyond(part(*n))) {
            let (mut low, mut high) = (part(first - 1), part(first));
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if is_beyond(middle) { high = middle } else { low = middle }
            }
            until = low - SPAN_MIN * SPAN_MIN.sqrt() * span;
        }
        while until > SPAN_MIN && !is_shown(until) {
            until *= 0.5;
        }
        until
    }

    /// From `centre` to rest, where the box of what is left leaves little open.
    pub(super) fn rest(&self, law: &super::Law<'_>, centre: &Centre, limit: Ball) -> Option<State<Ball>> {
        let state = centre.until_rest(law)?;
        let left = centre.velocity() / self.deceleration(centre.depth(), centre.velocity());
        let open = OPEN_AT_REST * state.time.value() + 4.0 * (left.radius + centre.time.radius);
        (left.radius.is_finite() && state.time.radius <= open && is_before(state.depth, limit)).then_some(state)
    }

    /// From `centre` through a box in which the force hardly changes, of the length at which that adds little: across a kink,
    /// and away from a place where the force has no series. `unit` is a time (s) to begin with.
    pub(super) fn across(&self, centre: &Centre, limit: Ball, unit: f64) -> Step {
        let (x, v) = (centre.depth(), centre.velocity());
        let (slowest, fastest) = (v.lower(), v.upper());
        let inherent = self.deceleration(x, v).radius;
        let mut time = BOX_MAX * unit;
        for _ in 0..BOXES_MAX {
            if let Some(next) = self.through(centre, time)
                && slowest > 0.0
                && is_before(next.depth(), limit)
            {
                let added = next.error.velocity - centre.error.velocity;
                let inherent = if inherent.is_finite() { inherent * time } else { 0.0 };
                if added <= ADDED * fastest + 2.0 * inherent {
                    return Step::Whole(next);
                }
            }
            time /= 16.0;
        }
        Step::Unproved
    }

    /// Depths and velocities up to `time` (s) after `centre`, and the deceleration there; `None` where the velocity changes much.
    pub(super) fn spread(&self, centre: &Centre, time: f64) -> Option<(Ball, Ball, Ball)> {
        let (x, v) = (centre.depth(), centre.velocity());
        let (slowest, fastest) = (v.lower(), v.upper());
        let mut speeds = Ball::between(0.5 * slowest, 2.0 * fastest);
        let (mut depths, mut slope) = (x, Ball::zero());
        for _ in 0..2 {
            depths = Ball::between(x.lower(), (x + speeds * Ball::from_f64(time)).upper());
            slope = self.deceleration(depths, speeds);
            let change = slope.magnitude() * time * UP;
            if !(slowest > 0.0 && change < 0.5 * slowest) {
                return None;
            }
            speeds = v.widened(change);
        }
        Some((depths, speeds, slope))
    }

    /// The state `time` (s) after `centre`, with the mean force of a box.
    fn through(&self, centre: &Centre, time: f64) -> Option<Centre> {
        let (depths, speeds, slope) = self.spread(centre, time)?;
        if !self.is_open(depths, speeds) {
            return None;
        }
        let (x, v) = (centre.depth(), centre.velocity());
        let duration = Ball::from_f64(time);
        let velocity = v - slope * duration;
        let depth = x + v * duration - (slope * duration * duration).scaled(0.5);
        let error = Error { norm: velocity.radius, velocity: velocity.radius, depth: depth.radius };
        Some(Centre { time: centre.time + duration, x: depth.mid, v: velocity.mid, error })
    }
}

/// The Taylor shift of a polynomial by one multiplication and addition, `add`, at a time (Horner and Ruffini).
fn shift<T: Copy>(coefficients: &mut [T], add: impl Fn(&mut T, T)) {
    for first in 0..coefficients.len() {
        for k in (first..coefficients.len() - 1).rev() {
            let next = coefficients[k + 1];
            add(&mut coefficients[k], next);
        }
    }
}
