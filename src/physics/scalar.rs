//! What a number must do for the time-domain integrators: ring operations, a square root, a value to compare.
//!
//! The same integrator then runs in `f32`, `f64`, double-double (`twofloat`) and dual numbers (`num_dual`),
//! none of which share a usable trait: dual numbers do not implement `num_traits::Float`.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

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

    /// Zero.
    fn zero() -> Self {
        Self::from_f64(0.0)
    }

    /// One.
    fn one() -> Self {
        Self::from_f64(1.0)
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

    fn sqrt(self) -> Self {
        num_dual::DualNum::sqrt(&self)
    }
}
