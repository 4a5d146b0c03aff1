//! What a number must do for the time-domain integrators: ring operations, a square root, a value to compare, and the
//! functions of [`Elementary`] for laws of one's own.
//!
//! The same integrator then runs in `f32`, `f64`, double-double (`twofloat`) and dual numbers (`num_dual`),
//! none of which share a usable trait: dual numbers do not implement `num_traits::Float`.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::elementary::Elementary;

/// A real number, possibly carrying more than its value (derivatives, a low part).
pub trait Scalar:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Elementary
{
    /// Relative spacing of the values near one: the unit in which this number rounds.
    const EPSILON: f64;

    /// The number with the value `value` and nothing else to it.
    fn from_f64(value: f64) -> Self;

    /// The value, rounded to `f64`: what every comparison and every step-size decision uses.
    fn value(self) -> f64;

    /// The non-negative square root. NaN below zero.
    #[must_use]
    fn sqrt(self) -> Self;

    /// The quotient `self / divisor`, as exact as the number type rounds.
    ///
    /// To be used for `/` wherever the low part matters: the operator of `twofloat` 0.8.4 takes the residual
    /// `1 - b (1/b)` in plain `f64` and is good to 2e-16 only.
    #[must_use]
    #[inline]
    fn over(self, divisor: Self) -> Self {
        self / divisor
    }

    /// Whether it has nothing but its value: all its derivatives are zero.
    #[inline(always)]
    fn is_constant(self) -> bool {
        true
    }

    /// The decimal that `value` is the shortest text of: 0.1 and not the `f64` beside it, in a number type that tells them
    /// apart.
    fn decimal(value: f64) -> Self {
        Self::from_f64(value)
    }

    /// What a number in a text means whose `f64` is `value`. A `short` one has at most 15 digits, and is the shortest decimal of
    /// its `f64`; pi and e count as short.
    fn literal(value: f64, _short: bool) -> Self {
        Self::from_f64(value)
    }

    /// Whether it is known to be zero.
    fn is_zero(self) -> bool {
        self.value() == 0.0
    }

    /// Whether numbers are known in a range, which rounding may take beyond zero.
    const HAS_RANGE: bool = false;

    /// Whether it is known not to be negative.
    fn is_not_negative(self) -> bool {
        self.value() >= 0.0
    }

    /// The same of a number that cannot be negative: without what lies below zero.
    #[must_use]
    fn not_negative(self) -> Self {
        self
    }

    /// `above` where this is not negative, else `below`; none where this has no value.
    #[must_use]
    #[inline]
    fn select(self, above: Self, below: Self) -> Self {
        if self.value() >= 0.0 {
            above
        } else if self.value() < 0.0 {
            below
        } else {
            self
        }
    }

    /// pi/4, as exact as the number type says that it is.
    fn quarter_pi() -> Self {
        Self::from_f64(std::f64::consts::FRAC_PI_4)
    }

    /// Zero.
    fn zero() -> Self {
        Self::from_f64(0.0)
    }

    /// One.
    fn one() -> Self {
        Self::from_f64(1.0)
    }
}

/// `1/k` for the recurrences, correctly rounded to `f64`.
const RECIPROCALS: [f64; 64] = {
    let mut table = [0.0; 64];
    let mut k = 1;
    while k < 64 {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

/// `1/k` in the number type: from the table unless the type is finer than `f64`.
#[inline(always)]
pub(crate) fn reciprocal<S: Scalar>(k: usize) -> S {
    if S::EPSILON < f64::EPSILON { S::one().over(S::from_f64(k as f64)) } else { S::from_f64(RECIPROCALS[k]) }
}

/// A number to which smooth functions apply by value and slope: `f64`, and the dual numbers over it.
pub trait Differentiable: Scalar {
    /// `f(self)`, from `value` = f at the value of `self`, and `slope` = f' there.
    #[must_use]
    fn apply(self, value: f64, slope: impl FnOnce() -> f64) -> Self;

    /// `e^z - 1`, without cancellation at zero.
    #[must_use]
    #[inline]
    fn exp_m1(self) -> Self {
        let value = self.value().exp_m1();
        self.apply(value, || value + 1.0)
    }
}

impl Differentiable for f64 {
    #[inline(always)]
    fn apply(self, value: f64, _slope: impl FnOnce() -> f64) -> Self {
        value
    }
}

impl Differentiable for f32 {
    fn apply(self, value: f64, _slope: impl FnOnce() -> f64) -> Self {
        value as Self
    }
}

impl Differentiable for num_dual::Dual64 {
    fn apply(self, value: f64, slope: impl FnOnce() -> f64) -> Self {
        // A constant has no derivative, also where the slope is infinite.
        if self.eps == 0.0 { Self::from_re(value) } else { Self::new(value, slope() * self.eps) }
    }
}

impl Scalar for f64 {
    const EPSILON: f64 = Self::EPSILON;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

impl Scalar for f32 {
    const EPSILON: f64 = Self::EPSILON as f64;

    fn from_f64(value: f64) -> Self {
        value as Self
    }

    fn value(self) -> f64 {
        f64::from(self)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

impl Scalar for twofloat::TwoFloat {
    // 2^-104: two f64 significands less the bits that the error-free sums spend.
    const EPSILON: f64 = 4.930_380_657_631_324e-32;

    fn from_f64(value: f64) -> Self {
        Self::from(value)
    }

    fn value(self) -> f64 {
        self.hi()
    }

    fn over(self, divisor: Self) -> Self {
        // One correction by the residual, which its product and difference do give in full.
        let rough = self / divisor;
        rough + (self - rough * divisor) / divisor
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

impl Scalar for num_dual::Dual64 {
    const EPSILON: f64 = f64::EPSILON;

    fn from_f64(value: f64) -> Self {
        Self::from_re(value)
    }

    fn value(self) -> f64 {
        self.re
    }

    fn is_constant(self) -> bool {
        self.eps == 0.0
    }

    fn sqrt(self) -> Self {
        let root = self.re.sqrt();
        self.apply(root, || 0.5 / root)
    }
}

#[cfg(test)]
mod tests {
    use twofloat::TwoFloat;

    use super::*;

    /// The operator misses by 1e-16; once it no longer does, `over` may go.
    #[test]
    fn double_double_quotient_is_exact_where_the_operator_is_not() {
        let (mut worst, mut worst_of_operator) = (0.0_f64, 0.0_f64);
        for n in 1..1000 {
            let (a, b) = (TwoFloat::from(f64::from(n)), TwoFloat::new_add(7.0 / f64::from(n), 1e-18));
            worst = worst.max((a.over(b) * b - a).value().abs() / a.value());
            worst_of_operator = worst_of_operator.max((a / b * b - a).value().abs() / a.value());
        }
        assert!(worst < 4.0 * <TwoFloat as Scalar>::EPSILON, "{worst:e}");
        assert!(worst_of_operator > 1e-18, "{worst_of_operator:e}");
    }

    #[test]
    fn double_double_root_squares_back() {
        for n in 2..1000 {
            let a = TwoFloat::from(f64::from(n));
            let root = Scalar::sqrt(a);
            assert!((root * root - a).value().abs() < 8.0 * <TwoFloat as Scalar>::EPSILON * a.value(), "{n}");
        }
    }

    #[test]
    fn every_entry_of_the_table_is_the_reciprocal_of_its_place() {
        for (k, entry) in RECIPROCALS.iter().enumerate().skip(1) {
            assert!((entry * k as f64 - 1.0).abs() <= 0.5 * f64::EPSILON, "{k}: {entry}");
        }
    }
}
