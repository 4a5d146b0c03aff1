//! Between which numbers lies the value of an expression, where x and V lie between two each?
//!
//! By intervals, term by term: rounded to nearest, and wider than need be where a term comes twice. What it shows is that
//! nothing hides inside a step that its ends do not show.

use smallvec::SmallVec;

use super::bound::{Bound, Step, Value};
use super::parse::Function;
use crate::physics::scalar::Scalar;

/// Least and greatest value.
pub(super) type Range = (f64, f64);

/// No bound at all.
const ALL: Range = (f64::NEG_INFINITY, f64::INFINITY);

fn hull(values: impl IntoIterator<Item = f64>) -> Range {
    let range = values.into_iter().try_fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (!value.is_nan()).then_some((value.min(low), value.max(high)))
    });
    range.unwrap_or(ALL)
}

fn product((a, b): Range, (c, d): Range) -> Range {
    // Zero times a bound that is missing is zero.
    let times = |p: f64, q: f64| if p == 0.0 || q == 0.0 { 0.0 } else { p * q };
    hull([times(a, c), times(a, d), times(b, c), times(b, d)])
}

fn inverse((a, b): Range) -> Range {
    if a > 0.0 || b < 0.0 { (1.0 / b, 1.0 / a) } else { ALL }
}

/// Of a function that rises all through.
fn rising((a, b): Range, function: impl Fn(f64) -> f64) -> Range {
    hull([function(a), function(b)])
}

/// Of the greater or the lesser of two.
fn extreme(one: Range, other: Range, greater: bool) -> Range {
    if [one.0, one.1, other.0, other.1].into_iter().any(f64::is_nan) {
        return ALL;
    }
    let of = if greater { f64::max } else { f64::min };
    (of(one.0, other.0), of(one.1, other.1))
}

/// Of sine, or of cosine as `sin(z + pi/2)`.
fn sine((a, b): Range, shift: f64) -> Range {
    use std::f64::consts::{FRAC_PI_2, TAU};
    let (a, b) = (a + shift, b + shift);
    // Whether `peak` and any number of turns lies in the range.
    let has = |peak: f64| ((b - peak) / TAU).floor() >= ((a - peak) / TAU).ceil();
    if !(b - a < TAU) {
        return (-1.0, 1.0);
    }
    let (low, high) = hull([a.sin(), b.sin()]);
    (if has(-FRAC_PI_2) { -1.0 } else { low }, if has(FRAC_PI_2) { 1.0 } else { high })
}

fn power(base: Range, exponent: f64) -> Range {
    let (a, b) = base;
    let whole = exponent.fract() == 0.0;
    if a >= 0.0 {
        return if a == 0.0 && exponent < 0.0 { ALL } else { hull([a.powf(exponent), b.powf(exponent)]) };
    }
    if !whole || exponent < 0.0 {
        return ALL;
    }
    let (low, high) = hull([a.powf(exponent), b.powf(exponent)]);
    (if b > 0.0 { low.min(0.0) } else { low }, high)
}

impl<S: Scalar> Bound<S> {
    /// Bounds of the value for x and V between these; infinite where a term has no bound or no value.
    pub(crate) fn range(&self, x: Range, v: Range) -> Range {
        match self.result() {
            Value::Constant(constant) => (constant.value(), constant.value()),
            Value::Register(result) => self.ranges(x, v)[result],
        }
    }

    /// The same of each register.
    pub(crate) fn ranges(&self, x: Range, v: Range) -> SmallVec<[Range; 32]> {
        let mut ranges: SmallVec<[Range; 32]> = SmallVec::with_capacity(self.registers());
        ranges.extend([x, v]);
        for step in self.steps() {
            let of = |register: usize| ranges[register];
            let scaled = |range: Range, factor: S| product(range, (factor.value(), factor.value()));
            let sum = |a: Range, b: Range| (a.0 + b.0, a.1 + b.1);
            let (first, second) = match *step {
                Step::Constant { value } => ((value.value(), value.value()), ALL),
                Step::Affine { a, factor, shift } => (sum(scaled(of(a), factor), (shift.value(), shift.value())), ALL),
                Step::Sum { a, b, factor } => (sum(of(a), scaled(of(b), factor)), ALL),
                Step::Share { a, divisor, .. } => (scaled(of(a), S::one().over(divisor)), ALL),
                Step::Multiply { a, b } => (product(of(a), of(b)), ALL),
                Step::Square { a } => (power(of(a), 2.0), ALL),
                Step::Divide { a, b } => (product(of(a), inverse(of(b))), inverse(of(b))),
                Step::Ratio { dividend, b } => (scaled(inverse(of(b)), dividend), inverse(of(b))),
                Step::Slope { .. } => (ALL, ALL),
                Step::Select { switch, above, below, greater, .. } => match of(switch) {
                    (low, _) if low >= 0.0 => (of(above), ALL),
                    (_, high) if high < 0.0 => (of(below), ALL),
                    _ => (extreme(of(above), of(below), greater), ALL),
                },
                Step::Sqrt { a } => {
                    let root = rising((of(a).0.max(0.0), of(a).1), f64::sqrt);
                    (root, inverse((2.0 * root.0, 2.0 * root.1)))
                }
                Step::HalfPower { a, exponent, .. } => (power((of(a).0.max(0.0), of(a).1), exponent), ALL),
                Step::Power { a, exponent, .. } => (power(of(a), exponent.value()), inverse(of(a))),
                Step::Exp { a, .. } => (rising(of(a), f64::exp), ALL),
                Step::SinCos { a, .. } => (sine(of(a), 0.0), sine(of(a), std::f64::consts::FRAC_PI_2)),
                Step::Tanh { a, .. } => (rising(of(a), f64::tanh), ALL),
                Step::Integral { function, a, .. } => {
                    let range = match function {
                        Function::Log => rising((of(a).0.max(0.0), of(a).1), f64::ln),
                        Function::Log10 => rising((of(a).0.max(0.0), of(a).1), f64::log10),
                        Function::Atan => rising(of(a), f64::atan),
                        _ => ALL,
                    };
                    (range, ALL)
                }
            };
            ranges.push(first);
            if step.width() == 2 {
                ranges.push(second);
            }
        }
        ranges
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a text that is no expression is a failed test")]
mod tests {
    use crate::physics::expression::{Known, Tape, Unit};
    use crate::physics::units::Dimension;
    use crate::testing::Random;

    #[test]
    fn every_value_lies_between_the_bounds_and_a_narrow_box_has_narrow_ones() {
        let known = |name, value, dimension: Dimension| Known { name, value, unit: dimension.into() };
        let known = [known("l", 0.3, Dimension::Length), known("u", 40.0, Dimension::Velocity)];
        let mut random = Random::new(3);
        for text in [
            "(x/l - 1)^2 - (V/u)^3 + 2",
            "exp(-((x/l - 1)/0.1)^2)*(1 + V/u)",
            "tanh(x/l - V/u)*abs(x/l - 1) - min(V/u, x/l)",
            "sin(3*x/l)*cos(V/u) + max(x/l, 1 - V/u)",
            "log(1 + V/u)/(2 + x/l) + log10(2 + x/l) + atan(x/l - 1)",
            "(1 + V/u)^1.5 + (V/u)^0.2 + sqrt(1 + x/l)/(1 + x/l)^-2 + 1/(3 - sin(V/u))",
            "max(0, 1 - ((x/l - 1)/0.3)^2) + min(1, V/u - x/l)",
        ] {
            let tape = Tape::read(text, &known, Unit::NONE).unwrap();
            let bound = tape.bind(tape.parameters());
            for _ in 0..2000 {
                let (x, v) = (random.uniform(0.0, 0.9), random.uniform(0.0, 90.0));
                let size = random.log_uniform(1e-9, 1.0);
                let (low, high) = bound.range((x, x + 0.5 * size), (v, v + 50.0 * size));
                let value =
                    bound.eval(x + 0.5 * size * random.uniform(0.0, 1.0), v + 50.0 * size * random.uniform(0.0, 1.0));
                let rounding = 1e-14 * (1.0 + value.abs());
                assert!(low - rounding <= value && value <= high + rounding, "{text}: {value} in {low} .. {high}");
                // The steepest is the Gaussian of width l/10, about 30/m at three times its height.
                assert!(high - low <= 1e-9 + 400.0 * size || size > 1e-3, "{text}: {low} .. {high} over {size}");
            }
        }
    }
}
