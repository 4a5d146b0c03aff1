//! The functions that laws of resistance are made of, in every number type: exp, log, sine and others.
//!
//! `twofloat` has them to 16 digits or so, for its division and some of its series are no better; those here have 29.

use twofloat::{TwoFloat, consts};

use super::scalar::{Differentiable, Scalar};

/// A number with elementary functions: `f64`, dual numbers, double-doubles.
pub trait Elementary: Copy {
    /// Exponential function.
    #[must_use]
    fn exp(self) -> Self;

    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// `ln(1 + self)`, without loss near zero.
    #[must_use]
    fn ln_1p(self) -> Self;

    /// Decimal logarithm.
    #[must_use]
    fn log10(self) -> Self;

    /// Sine.
    #[must_use]
    fn sin(self) -> Self;

    /// Cosine.
    #[must_use]
    fn cos(self) -> Self;

    /// Hyperbolic tangent.
    #[must_use]
    fn tanh(self) -> Self;

    /// Arc tangent.
    #[must_use]
    fn atan(self) -> Self;

    /// `self^exponent`; of a negative number only for a whole exponent.
    #[must_use]
    fn powf(self, exponent: Self) -> Self;

    /// `value`, of a function of `self` with this `slope`, which gives the derivatives where the number has any.
    #[must_use]
    fn with_slope(self, value: Self, slope: impl FnOnce() -> f64) -> Self;
}

impl<S: Differentiable> Elementary for S {
    #[inline]
    fn exp(self) -> Self {
        let value = self.value().exp();
        self.apply(value, || value)
    }

    #[inline]
    fn ln(self) -> Self {
        let value = self.value();
        self.apply(value.ln(), || 1.0 / value)
    }

    #[inline]
    fn ln_1p(self) -> Self {
        let value = self.value();
        self.apply(value.ln_1p(), || 1.0 / (1.0 + value))
    }

    #[inline]
    fn log10(self) -> Self {
        let value = self.value();
        self.apply(value.log10(), || std::f64::consts::LOG10_E / value)
    }

    #[inline]
    fn sin(self) -> Self {
        let value = self.value();
        self.apply(value.sin(), || value.cos())
    }

    #[inline]
    fn cos(self) -> Self {
        let value = self.value();
        self.apply(value.cos(), || -value.sin())
    }

    #[inline]
    fn tanh(self) -> Self {
        let value = self.value();
        // Not 1 - tanh², which is all rounding where tanh is near one.
        self.apply(value.tanh(), || value.cosh().powi(-2))
    }

    #[inline]
    fn atan(self) -> Self {
        let value = self.value();
        self.apply(value.atan(), || 1.0 / (1.0 + value * value))
    }

    #[inline]
    fn powf(self, exponent: Self) -> Self {
        let (base, power) = (self.value(), exponent.value());
        let value = base.powf(power);
        let by_base = self.apply(value, || if power == 0.0 { 0.0 } else { power * base.powf(power - 1.0) });
        // value ln(base) tends to zero with the value.
        by_base + exponent.apply(0.0, || if value == 0.0 { 0.0 } else { value * base.ln() })
    }

    #[inline]
    fn with_slope(self, value: Self, slope: impl FnOnce() -> f64) -> Self {
        self.apply(value.value(), slope)
    }
}

/// Terms of [`logarithm_by_series`], and the size below which those behind them are less than 1e-33 of it.
pub(super) const TERMS_OF_LOGARITHM: i32 = 16;
pub(super) const LOGARITHM_BY_SERIES: f64 = 0.01;

/// `ln(1 + z) = z - z²/2 + z³/3 - ...`
pub(super) fn logarithm_by_series<S: Scalar>(z: S) -> S {
    let part = |k: i32| S::one().over(S::from_f64(f64::from(k)));
    z * (1..TERMS_OF_LOGARITHM).rev().fold(part(TERMS_OF_LOGARITHM), |sum, k| part(k) - z * sum)
}

impl Elementary for TwoFloat {
    fn exp(self) -> Self {
        let value = f64::exp(self.hi());
        if value == 0.0 || !value.is_finite() {
            return Self::from(value);
        }
        // e^z = 2^k e^r. In two halves, since 2^k may be beyond f64 where e^z is not.
        let k = (self.hi() * std::f64::consts::LOG2_E).round();
        let half = (0.5 * k).trunc();
        (exp_m1(self - consts::LN_2 * k) + 1.0) * half.exp2() * (k - half).exp2()
    }

    fn ln(self) -> Self {
        let near = f64::ln(self.hi());
        if !near.is_finite() {
            return Self::from(near);
        }
        // One step of Newton's method for e^y = z, from 16 digits to 32.
        self * Elementary::exp(Self::from(-near)) - 1.0 + near
    }

    fn ln_1p(self) -> Self {
        if self.hi().abs() < LOGARITHM_BY_SERIES {
            return logarithm_by_series(self);
        }
        Elementary::ln(self + 1.0)
    }

    fn log10(self) -> Self {
        Elementary::ln(self).over(consts::LN_10)
    }

    fn sin(self) -> Self {
        sin_cos(self).0
    }

    fn cos(self) -> Self {
        sin_cos(self).1
    }

    fn tanh(self) -> Self {
        // Beyond, it is one to 34 digits.
        if self.hi().abs() > 40.0 {
            return Self::from(self.hi().signum());
        }
        let twice = self + self;
        // e^{2z} - 1, without cancellation at zero.
        let minus_one = if twice.hi().abs() < 0.4 { exp_m1(twice) } else { Elementary::exp(twice) - 1.0 };
        minus_one.over(minus_one + 2.0)
    }

    fn atan(self) -> Self {
        let near = f64::atan(self.hi());
        if !self.hi().is_finite() {
            return Self::from(near);
        }
        // The angle that is left is its tangent, to the third power of 1e-16.
        let (sine, cosine) = sin_cos(Self::from(near));
        (self * cosine - sine).over(cosine + self * sine) + near
    }

    fn powf(self, exponent: Self) -> Self {
        let near = f64::powf(self.hi(), exponent.hi());
        if near == 0.0 || !near.is_finite() || exponent.hi() == 0.0 {
            return Self::from(near);
        }
        let size = Elementary::exp(exponent * Elementary::ln(if self.hi() < 0.0 { -self } else { self }));
        if near < 0.0 { -size } else { size }
    }

    fn with_slope(self, value: Self, _slope: impl FnOnce() -> f64) -> Self {
        value
    }
}

/// `e^r - 1` of a small number, below 0.4: the series of `r/512`, and nine times `(1 + s)² - 1 = 2 s + s²`.
fn exp_m1(r: TwoFloat) -> TwoFloat {
    let r = r * (1.0 / 512.0);
    // 1 + r/2 (1 + r/3 (...)), to 1e-33.
    let series = (2..=10).rev().fold(TwoFloat::from(1.0), |sum, n| (r * sum).over(TwoFloat::from(f64::from(n))) + 1.0);
    (0..9).fold(r * series, |s, _| s + s + s * s)
}

/// Sine and cosine.
fn sin_cos(z: TwoFloat) -> (TwoFloat, TwoFloat) {
    let quarters = (z.hi() * std::f64::consts::FRAC_2_PI).round();
    if !quarters.is_finite() {
        return (TwoFloat::from(f64::NAN), TwoFloat::from(f64::NAN));
    }
    let r = z - consts::FRAC_PI_2 * quarters;
    let minus_square = -(r * r);
    // 1 - r²/((n+1)(n+2)) (1 - ...), from n on, to 1e-33 for |r| < 0.8.
    let series = |first: i32| {
        let terms = (0..15).map(|k| f64::from((first + 2 * k + 1) * (first + 2 * k + 2)));
        terms.rev().fold(TwoFloat::from(1.0), |sum, divisor| (minus_square * sum).over(TwoFloat::from(divisor)) + 1.0)
    };
    let (sine, cosine) = (r * series(1), series(0));
    match quarters.rem_euclid(4.0) as u8 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use dashu_float::FBig;
    use dashu_float::round::mode::HalfEven;

    use super::*;
    use crate::testing::Random;

    type Big = FBig<HalfEven, 2>;

    fn big(value: f64) -> Big {
        Big::try_from(value).unwrap_or(Big::ZERO).with_precision(256).value()
    }

    fn sum(value: TwoFloat) -> Big {
        big(value.hi()) + big(value.lo())
    }

    /// Largest relative error of `function` over numbers of all sizes from `low` to `high`, with either sign if `signed`.
    fn worst(function: fn(TwoFloat) -> TwoFloat, exact: fn(&Big) -> Big, (low, high, signed): (f64, f64, bool)) -> f64 {
        let mut random = Random::new(1);
        let mut error = |_| {
            let sign = if signed && random.chance(0.5) { -1.0 } else { 1.0 };
            let size = random.log_uniform(low, high);
            let z = TwoFloat::new_add(sign * size, size * random.uniform(-1e-17, 1e-17));
            let digits = exact(&sum(z));
            ((sum(function(z)) - &digits) / digits).to_f64().value().abs()
        };
        (0..300).map(&mut error).fold(0.0, f64::max)
    }

    #[test]
    fn functions_of_double_doubles_have_29_digits() {
        for (name, error) in [
            ("exp", worst(Elementary::exp, Big::exp, (1e-10, 700.0, true))),
            ("ln", worst(Elementary::ln, Big::ln, (1e-200, 1e200, false))),
            ("ln_1p", worst(Elementary::ln_1p, Big::ln_1p, (1e-40, 1e40, false))),
            ("ln_1p below zero", worst(|z| Elementary::ln_1p(-z), |z| (-z).ln_1p(), (1e-40, 0.7, false))),
            ("log10", worst(Elementary::log10, |z| z.ln() / big(10.0).ln(), (1e-9, 0.1, false))),
            ("sin", worst(Elementary::sin, Big::sin, (1e-10, 3.0, true))),
            ("cos", worst(Elementary::cos, Big::cos, (1e-10, 1.5, true))),
            ("tanh", worst(Elementary::tanh, Big::tanh, (1e-10, 39.0, true))),
            ("atan", worst(Elementary::atan, Big::atan, (1e-10, 1e10, true))),
            ("powf", worst(|z| Elementary::powf(z, TwoFloat::from(1.8)), |z| z.powf(&big(1.8)), (1e-20, 1e20, false))),
        ] {
            assert!(error < 1e-29, "{name}: {error:e}");
        }
    }

    #[test]
    fn functions_of_double_doubles_end_as_those_of_f64_do() {
        let f = |z: f64| {
            let z = TwoFloat::from(z);
            [Elementary::exp(z), Elementary::ln(z), Elementary::sin(z), Elementary::tanh(z), Elementary::atan(z)]
                .map(Scalar::value)
        };
        let g = |z: f64| [z.exp(), z.ln(), z.sin(), z.tanh(), z.atan()];
        for z in [0.0, -1.0, 1.0, 1e3, -1e3, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            for (found, expected) in f(z).into_iter().zip(g(z)) {
                assert!(
                    found == expected || (found.is_nan() && expected.is_nan()) || (found - expected).abs() < 1e-15,
                    "{z}: {found} {expected}"
                );
            }
        }
        for (base, exponent) in [(0.0, 1.5), (0.0, -1.0), (-2.0, 3.0), (-2.0, 2.0), (-2.0, 0.5), (0.0, 0.0), (5.0, 0.0)]
        {
            let found = Elementary::powf(TwoFloat::from(base), TwoFloat::from(exponent)).value();
            let expected = f64::powf(base, exponent);
            assert!(found == expected || (found.is_nan() && expected.is_nan()), "{base}^{exponent}: {found}");
        }
    }
}
