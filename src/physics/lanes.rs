//! Numbers of several problems side by side: the same operations on all of them, which the compiler turns into vector instructions.
//!
//! Each lane is rounded as it would be alone.

use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::elementary::Elementary;
use super::scalar::Scalar;

/// N numbers, one a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub(crate) struct Lanes<const N: usize>(pub(crate) [f64; N]);

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        Self(from_fn(|lane| function(self.0[lane])))
    }

    #[inline(always)]
    fn with(self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self {
        Self(from_fn(|lane| function(self.0[lane], other.0[lane])))
    }
}

impl<const N: usize> Add for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl<const N: usize> Div for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize> AddAssign for Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Lanes<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize> Scalar for Lanes<N> {
    const EPSILON: f64 = f64::EPSILON;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self([value; N])
    }

    /// That of the first lane: nothing that lanes may differ in is to be decided by it.
    fn value(self) -> f64 {
        self.0[0]
    }

    /// Whether all are.
    fn is_zero(self) -> bool {
        self.0.iter().all(|value| *value == 0.0)
    }

    /// Whether none is.
    fn is_not_negative(self) -> bool {
        self.0.iter().all(|value| *value >= 0.0)
    }

    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    fn select(self, above: Self, below: Self) -> Self {
        Self(from_fn(|lane| self.0[lane].select(above.0[lane], below.0[lane])))
    }
}

impl<const N: usize> Elementary for Lanes<N> {
    fn exp(self) -> Self {
        self.map(Elementary::exp)
    }

    fn ln(self) -> Self {
        self.map(Elementary::ln)
    }

    fn ln_1p(self) -> Self {
        self.map(Elementary::ln_1p)
    }

    fn log10(self) -> Self {
        self.map(Elementary::log10)
    }

    fn sin(self) -> Self {
        self.map(Elementary::sin)
    }

    fn cos(self) -> Self {
        self.map(Elementary::cos)
    }

    fn tanh(self) -> Self {
        self.map(Elementary::tanh)
    }

    fn atan(self) -> Self {
        self.map(Elementary::atan)
    }

    fn powf(self, exponent: Self) -> Self {
        self.with(exponent, Elementary::powf)
    }

    fn with_slope(self, value: Self, _slope: impl FnOnce() -> f64) -> Self {
        value
    }
}
