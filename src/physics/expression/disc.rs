//! How large may the value of an expression get, where x and V lie in discs of the complex plane?
//!
//! A function with the bound M in a disc of the radius R has coefficients within `M/R^k` about its centre (Cauchy), so that a series
//! shows it on a part of the disc, and so does a polynomial through a few places. What is narrow has no bound there: the terms
//! `exp(-(x/w)²)` and `1/(1 + (x/w)²)` of a disc a few w wide.
//!
//! Each term is a disc again, about the value at the centre. Its radius is that of the majorant, the series of the absolute values of
//! its coefficients: f64 rounded to nearest.

use std::cell::LazyCell;

use smallvec::SmallVec;

use super::bound::{Bound, Step, Value};
use super::jets::{Fall, Falling};
use super::parse::Function;
use super::range::Range;
use crate::physics::scalar::Scalar;

/// Radius of a disc around a path that is known at its ends, over half of it.
#[cfg(feature = "diffsol")]
const DISC: f64 = 2.0;

/// Share of a switch by which it may lie beyond its root: that is rounded.
const ROUNDING: f64 = 1e-9;

/// The numbers within `radius` of a real `centre`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Disc {
    pub(crate) centre: f64,
    /// Infinite, or no number, where there is no bound.
    pub(crate) radius: f64,
}

/// `x^exponent`, the powers of nearly all laws by products.
fn raised(x: f64, exponent: f64) -> f64 {
    match exponent {
        0.0 => 1.0,
        1.0 => x,
        2.0 => x * x,
        3.0 => x * x * x,
        _ => x.powf(exponent),
    }
}

impl Disc {
    /// The bound on a disc over the greatest value seen on it, above which something may hide there.
    pub(crate) const HIDDEN_MAX: f64 = 1e3;

    pub(crate) const fn new(centre: f64, radius: f64) -> Self {
        Self { centre, radius }
    }

    pub(crate) const fn of(value: f64) -> Self {
        Self::new(value, 0.0)
    }

    /// Bound of the absolute value; infinite where there is none.
    pub(crate) fn size(self) -> f64 {
        let size = self.centre.abs() + self.radius;
        if size.is_finite() { size } else { f64::INFINITY }
    }

    /// Whether it shows what has the largest value `seen`, so that nothing narrow hides.
    pub(crate) fn shows(self, seen: f64) -> bool {
        self.size() <= Self::HIDDEN_MAX * seen
    }

    /// Whether it leaves room for one sign only.
    pub(crate) fn has_one_sign(self) -> bool {
        self.centre.abs() > self.radius
    }

    fn scaled(self, factor: f64) -> Self {
        Self::new(self.centre * factor, self.radius * factor.abs())
    }

    fn plus(self, other: Self) -> Self {
        Self::new(self.centre + other.centre, self.radius + other.radius)
    }

    fn times(self, other: Self) -> Self {
        let radius = self.centre.abs() * other.radius + other.centre.abs() * self.radius + self.radius * other.radius;
        Self::new(self.centre * other.centre, radius)
    }

    /// About the value at the centre, not the middle of the image.
    fn inverse(self) -> Self {
        let nearest = self.centre.abs() - self.radius;
        Self::new(
            1.0 / self.centre,
            if nearest > 0.0 { self.radius / (self.centre.abs() * nearest) } else { f64::INFINITY },
        )
    }

    /// Where the centre is above zero and the disc holds no zero; a power of constants besides.
    fn power(self, exponent: f64) -> Self {
        let value = raised(self.centre, exponent);
        if self.radius == 0.0 {
            return Self::of(value);
        }
        let ratio = self.radius / self.centre;
        let whole = exponent.max(0.0).floor();
        let rest = exponent - whole;
        if rest == 0.0 {
            let (size, more) = (self.centre.abs(), self.centre.abs() + self.radius);
            return Self::new(value, raised(more, whole) - raised(size, whole));
        }
        if !(ratio > 0.0 && ratio < 1.0) {
            return Self::new(value, f64::INFINITY);
        }
        // Of (1+z)^e, e below 1: all coefficients have signs in turn below zero, and above it all but the first are negative there.
        let majorant = ((1.0 - ratio).powf(rest) - 1.0).abs();
        let of_whole = raised(1.0 + ratio, whole);
        Self::new(value, value.abs() * (of_whole * (1.0 + majorant) - 1.0))
    }

    fn exp(self) -> Self {
        let value = self.centre.exp();
        let far = self.centre + self.radius;
        // The product would be none where the first factor rounds to zero and the second to no number.
        Self::new(value, if self.radius < 1.0 { value * self.radius.exp_m1() } else { far.exp() - value })
    }

    /// Sine, or cosine.
    fn sine(self, is_cosine: bool) -> Self {
        let (sin, cos) = self.centre.sin_cos();
        let (value, slope) = if is_cosine { (cos, sin) } else { (sin, cos) };
        Self::new(value, value.abs() * (self.radius.cosh() - 1.0) + slope.abs() * self.radius.sinh())
    }

    /// Near zero the majorant m has `m' = 1 - T² + 2 |T| m + m²`, T the value: a tangent. Elsewhere by `tanh z = 1 - 2/(1 + e^(2z))`.
    fn tanh(self) -> Self {
        let value = self.centre.tanh();
        let t = value.abs();
        if t < 0.5 {
            let rate = (1.0 - 2.0 * t * t).sqrt();
            let angle = rate * self.radius + (t / rate).atan();
            let radius = if angle < std::f64::consts::FRAC_PI_2 { rate * angle.tan() - t } else { f64::INFINITY };
            return Self::new(value, radius);
        }
        let share = Self::new(-2.0 * self.centre.abs(), 2.0 * self.radius).exp();
        // 2 w/(1 + w) = 2 - 2/(1 + w).
        Self::new(value, 2.0 * share.plus(Self::of(1.0)).inverse().radius)
    }

    fn log(self) -> Self {
        let ratio = self.radius / self.centre;
        Self::new(self.centre.ln(), if ratio < 1.0 { -(-ratio).ln_1p() } else { f64::INFINITY })
    }

    /// Its coefficients are within `D^-k/k`, D the distance to the branch points.
    fn atan(self) -> Self {
        let ratio = self.radius / 1.0_f64.hypot(self.centre);
        Self::new(self.centre.atan(), if ratio < 1.0 { -(-ratio).ln_1p() } else { f64::INFINITY })
    }
}

/// Discs of x and of V, and how V falls over the variable of a step, with the disc of that.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around<'f> {
    pub(crate) x: Disc,
    pub(crate) v: Disc,
    pub(crate) fall: Option<(&'f Falling, Disc)>,
}

impl Around<'_> {
    /// Of V that falls from `v` (m/s) so, s in a disc.
    pub(crate) fn falling(x: Disc, v: f64, falling: &Falling, s: Disc) -> Around<'_> {
        Around { x, v: falling.fall.disc(1.0, s).unwrap_or(Disc::of(1.0)).scaled(v), fall: Some((falling, s)) }
    }
}

impl Fall {
    /// The disc of `(V/V0)^exponent`.
    fn disc(self, exponent: f64, s: Disc) -> Option<Disc> {
        if exponent.is_nan() {
            return None;
        }
        match self {
            Self::Exponential => Some(s.scaled(-exponent).exp()),
            Self::Power(m) => Some(Disc::new(1.0 - s.centre, s.radius).power(exponent * f64::from(m))),
        }
    }
}

/// The discs of all registers, on `sides` of the switches; `starts` gives the value of a register where V begins to fall.
pub(super) fn discs<S: Scalar>(
    steps: &[Step<S>],
    around: Around<'_>,
    sides: &[bool],
    start: impl Fn(usize) -> f64,
) -> SmallVec<[Disc; 32]> {
    let mut discs: SmallVec<[Disc; 32]> = SmallVec::from_slice(&[around.x, around.v]);
    for step in steps {
        let place = discs.len();
        let of = |register: usize| discs[register];
        let fallen = around.fall.and_then(|(falling, s)| match *step {
            _ if let Some(disc) = falling.fall.disc(falling.powers[place], s) => Some(disc.scaled(start(place))),
            Step::Integral { function: Function::Log | Function::Log10, a, factor, .. }
                if falling.fall == Fall::Exponential && !falling.powers[a].is_nan() =>
            {
                Some(Disc::of(start(place)).plus(s.scaled(-factor.value() * falling.powers[a])))
            }
            _ => None,
        });
        let mut second = Disc::of(0.0);
        let first = fallen.unwrap_or_else(|| match *step {
            Step::Constant { value } => Disc::of(value.value()),
            Step::Affine { a, factor, shift } => of(a).scaled(factor.value()).plus(Disc::of(shift.value())),
            Step::Sum { a, b, factor } => of(a).plus(of(b).scaled(factor.value())),
            Step::Share { a, divisor, .. } => of(a).scaled(1.0 / divisor.value()),
            Step::Multiply { a, b } | Step::HalfPower { whole: a, root: b, .. } => of(a).times(of(b)),
            Step::Square { a } => of(a).times(of(a)),
            Step::Divide { a, b } => of(a).times(of(b).inverse()),
            Step::Ratio { dividend, b } => of(b).inverse().scaled(dividend.value()),
            Step::Slope { .. } => Disc::of(0.0),
            Step::Sqrt { a } => of(a).power(0.5),
            Step::Power { a, exponent, .. } => of(a).power(exponent.value()),
            Step::Exp { a, .. } => of(a).exp(),
            Step::SinCos { a, .. } => {
                second = of(a).sine(true);
                of(a).sine(false)
            }
            Step::Tanh { a, .. } => of(a).tanh(),
            Step::Integral { function: Function::Log, a, .. } => of(a).log(),
            Step::Integral { function: Function::Log10, a, factor, .. } => of(a).log().scaled(factor.value()),
            Step::Integral { a, .. } => of(a).atan(),
            Step::Select { index, above, below, .. } => of(if sides[index] { above } else { below }),
        });
        discs.push(first);
        if step.width() == 2 {
            discs.push(second);
        }
    }
    discs
}

/// The disc of a value among those of all registers.
fn of<S: Scalar>(value: Value<S>, all: &[Disc]) -> Disc {
    match value {
        Value::Constant(constant) => Disc::of(constant.value()),
        Value::Register(register) => all[register],
    }
}

impl<S: Scalar> Bound<S> {
    /// The disc of the value and those of [`Bound::switches`], on `sides` of them; `start` gives the value of a register where V begins
    /// to fall.
    pub(crate) fn discs(
        &self,
        around: Around<'_>,
        sides: &[bool],
        start: impl Fn(usize) -> f64,
    ) -> (Disc, SmallVec<[Disc; 4]>) {
        let all = discs(self.steps(), around, sides, start);
        (of(self.result(), &all), self.switches().iter().map(|register| all[*register]).collect())
    }

    /// The discs of an expression of x without switches, and of the second one beside it.
    pub(crate) fn discs_of_both(&self, x: Disc) -> [Disc; 2] {
        let all = discs(self.steps(), Around { x, v: Disc::of(0.0), fall: None }, &[], |_| f64::NAN);
        let beside = self.beside().map_or(Disc::of(0.0), |beside| match beside {
            Ok(register) => all[register],
            Err(constant) => Disc::of(constant.value()),
        });
        [of(self.result(), &all), beside]
    }

    /// Of each switch, of which the largest value `seen` is known, whether its disc shows it, so that none of its roots is missed. One whose disc
    /// does not must keep its side of `sides` between depths `x` and velocities `v`: one that leaves it unseen hides a branch, `None`.
    pub(crate) fn shown(
        &self,
        switches: &[Disc],
        sides: &[bool],
        seen: impl Fn(usize) -> f64,
        (x, v): (Range, Range),
    ) -> Option<SmallVec<[bool; 4]>> {
        let ranges = LazyCell::new(|| self.ranges(x, v));
        let keeps = |switch: usize| keeps(ranges[self.switches()[switch]], sides[switch], ROUNDING * seen(switch));
        let shows = |switch: usize, disc: &Disc| disc.has_one_sign() || disc.shows(seen(switch));
        let shown = switches.iter().enumerate().map(|(switch, disc)| {
            let is_shown = shows(switch, disc);
            (is_shown || keeps(switch)).then_some(is_shown)
        });
        shown.collect()
    }

    /// Whether the ends of a path, depth (m) and velocity (m/s), and its middle show all that lies between: the value has a bound on a disc
    /// around them, and all switches keep their sides. One whose kink lies `at_kink`, the share of the path from each of its ends,
    /// leaves it there, since a kink is located with an error.
    #[cfg(feature = "diffsol")]
    pub(crate) fn is_shown_between(&self, [from, to]: [(f64, f64); 2], at_kink: [f64; 2]) -> bool {
        let between = |from: f64, to: f64| (from.min(to), from.max(to));
        let (x, v) = (between(from.0, to.0), between(from.1, to.1));
        let middle = (0.5 * (from.0 + to.0), 0.5 * (from.1 + to.1));
        let places = [from, middle, to].map(|(x, v)| (S::from_f64(x), S::from_f64(v)));
        let sides = self.sides(places[1].0, places[1].1);
        let around = |middle: f64, ends: Range| Disc::new(middle, DISC * 0.5 * (ends.1 - ends.0));
        let around = Around { x: around(middle.0, x), v: around(middle.1, v), fall: None };
        let (disc, _) = self.discs(around, &sides, |_| f64::NAN);
        let largest = |values: [f64; 3]| values.into_iter().map(f64::abs).fold(0.0, f64::max);
        if !disc.shows(largest(places.map(|(x, v)| self.eval(x, v).value()))) {
            return false;
        }
        let ranges = LazyCell::new(|| self.ranges(x, v));
        self.switches().iter().zip(&sides).enumerate().all(|(switch, (register, side))| {
            let values = places.map(|(x, v)| self.switch_values(x, v)[switch].value());
            let seen = largest(values);
            let beyond = [values[0], values[2]].map(|value| if *side { -value } else { value }.max(0.0));
            let left = beyond.into_iter().zip(at_kink).filter(|(beyond, share)| *beyond <= share * seen);
            keeps(ranges[*register], *side, left.map(|(beyond, _)| beyond).fold(ROUNDING * seen, f64::max))
        })
    }
}

/// Whether a switch in `range` keeps its side: it may begin or end at a root, rest say, as far as that is in `error`.
fn keeps((least, most): Range, side: bool, error: f64) -> bool {
    if side { least >= -error } else { most <= error }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a text that is no expression is a failed test")]
mod tests {
    use super::{Around, Disc};
    use crate::physics::expression::{Fall, Jets, Known, Tape, Unit};
    use crate::physics::units::Dimension;
    use crate::testing::Random;

    /// The coefficients of the series along a line through the centre add up to no more than the radius.
    #[test]
    fn a_disc_holds_what_the_series_along_any_line_adds_up_to() {
        let known = |name, value, dimension: Dimension| Known { name, value, unit: dimension.into() };
        let known = [known("l", 0.3, Dimension::Length), known("u", 40.0, Dimension::Velocity)];
        let mut random = Random::new(5);
        let mut bounded = 0;
        for text in [
            "(x/l - 1)^2 - (V/u)^3 + 2",
            "exp(-((x/l - 1)/0.1)^2)*(1 + V/u)",
            "tanh(x/l - V/u)*abs(x/l - 1) - min(V/u, x/l)",
            "sin(3*x/l)*cos(V/u) + max(x/l, 1 - V/u)",
            "log(1 + V/u)/(2 + x/l) + log10(2 + x/l) + atan(x/l - 1)",
            "(1 + V/u)^1.7 + (V/u)^0.2 + sqrt(1 + x/l)/(1 + x/l)^-2 + 1/(3 - sin(V/u))",
            "tanh(0.3*x/l) + tanh(4 - x/l) + (1 + x/l)^2.5 + (2 + V/u)^-0.7",
        ] {
            let tape = Tape::read(text, &known, Unit::NONE).unwrap();
            let bound = tape.bind(tape.parameters());
            for _ in 0..400 {
                let (x, v) = (random.uniform(0.1, 0.9), random.uniform(10.0, 90.0));
                let (dx, dv) = (random.log_uniform(1e-3, 0.3), random.log_uniform(0.1, 40.0));
                let sides = bound.sides(x, v);
                let around = Around { x: Disc::new(x, dx), v: Disc::new(v, dv), fall: None };
                let (disc, _) = bound.discs(around, &sides, |_| f64::NAN);
                let mut jets = Jets::default();
                jets.start(&bound, &sides);
                let first = jets.push(&bound, x, v);
                let next = [(dx, -dv), (0.0, 0.0)].into_iter().chain([(0.0, 0.0); 20]);
                let sum: f64 = next.map(|(dx, dv)| jets.push(&bound, dx, dv).abs()).sum();
                assert!((disc.centre - first).abs() <= 1e-14 * (1.0 + first.abs()), "{text}");
                assert!(!(sum > disc.radius * (1.0 + 1e-12) + 1e-14), "{text}: {sum} in {disc:?}");
                bounded += u32::from(disc.size() < 1e3);
            }
        }
        assert!(bounded > 1000, "{bounded}");
    }

    /// A switch may hold `V^0.03` where the force goes by `V^(1/3)`.
    #[test]
    fn any_power_of_a_velocity_that_falls_by_a_power_has_a_disc_up_to_rest() {
        for power in [0.0274, 0.5, 1.0, 1.7, -0.3, -1.0] {
            for (centre, radius) in [(0.3, 0.5), (0.4, 0.59), (0.0, 0.9)] {
                let disc = Fall::Power(3).disc(power, Disc::new(centre, radius)).unwrap();
                let value = |s: f64| (1.0 - s).powf(3.0 * power);
                assert!((disc.centre - value(centre)).abs() <= 1e-15 * value(centre), "{power}: {disc:?}");
                for s in [centre - radius, centre + radius, centre + 0.5 * radius] {
                    let off = (value(s) - disc.centre).abs();
                    assert!(off <= disc.radius * (1.0 + 1e-14), "{power} at {s}: {off} beyond {disc:?}");
                }
                assert!(disc.radius.is_finite(), "{power}: {disc:?}");
            }
        }
    }
}
