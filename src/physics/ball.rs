//! A number with a proved error: midpoint and radius. The arithmetic of enclosures (docs/enclosures.md, section 1).
//!
//! The midpoint is a double word, the unevaluated sum of two `f64` with 106 bits together. Each operation adds to the
//! radius what it may have rounded. Nothing is assumed of `f64` but IEEE 754 with rounding to nearest; no function of the
//! platform's mathematical library has a part in a bound.

use std::f64::consts::FRAC_PI_2;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::elementary::{Elementary, LOGARITHM_BY_SERIES, TERMS_OF_LOGARITHM, logarithm_by_series};
use super::scalar::Scalar;

/// Relative error of a sum or a product of double words: 3 and 7 units of 2^-106 (Joldes, Muller, Popescu 2017,
/// Algorithms 6 and 10), taken as 16.
pub(crate) const UNIT: f64 = 1.0 / (1_u128 << 102) as f64;

/// Covers the rounding of fewer than 4,000 additions and products of numbers that are not negative: 4,000 2^-53 < 2^-40.
pub(crate) const UP: f64 = 1.0 + 1.0 / (1_u64 << 40) as f64;

/// More than all that underflow can lose in the operations of one ball or one step, whose numbers are of order one or
/// scaled to it.
pub(crate) const TINY: f64 = 1e-290;

/// Splits a significand in halves of 26 bits.
const SPLITTER: f64 = 134_217_729.0;

/// The sum of two `f64` that are not added up: `|lo| <= 2^-53 |hi|`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DoubleWord {
    pub(crate) hi: f64,
    pub(crate) lo: f64,
}

/// `a + b` as rounded value and error, exact (Knuth).
#[inline(always)]
fn two_sum(a: f64, b: f64) -> DoubleWord {
    let hi = a + b;
    let b_of_sum = hi - a;
    DoubleWord { hi, lo: (a - (hi - b_of_sum)) + (b - b_of_sum) }
}

/// As [`two_sum`] where `|a| >= |b|` or a is zero (Dekel).
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> DoubleWord {
    let hi = a + b;
    DoubleWord { hi, lo: b - (hi - a) }
}

/// `a b` as rounded value and error, exact unless a part underflows (Dekel; no fused product, which is slow without
/// hardware for it and gives the same).
#[inline(always)]
fn two_product(a: f64, b: f64) -> DoubleWord {
    let halves = |x: f64| {
        let scaled = SPLITTER * x;
        let high = scaled - (scaled - x);
        (high, x - high)
    };
    let ((a_high, a_low), (b_high, b_low)) = (halves(a), halves(b));
    let hi = a * b;
    DoubleWord { hi, lo: a_low * b_low - (((hi - a_high * b_high) - a_low * b_high) - a_high * b_low) }
}

impl DoubleWord {
    /// The number `value`.
    #[inline(always)]
    pub(crate) fn of(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }

    /// Sum, within 3 of 2^-106 (Joldes et al., Algorithm 6).
    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        let (s, t) = (two_sum(self.hi, other.hi), two_sum(self.lo, other.lo));
        let v = quick_two_sum(s.hi, s.lo + t.hi);
        quick_two_sum(v.hi, t.lo + v.lo)
    }

    /// Product, within 7 of 2^-106 (Joldes et al., Algorithm 10).
    #[inline(always)]
    pub(crate) fn times(self, other: Self) -> Self {
        let c = two_product(self.hi, other.hi);
        quick_two_sum(c.hi, c.lo + (self.hi * other.lo + self.lo * other.hi))
    }

    /// Product with a power of two, exact unless it underflows.
    #[inline(always)]
    pub(crate) fn scaled(self, power: f64) -> Self {
        Self { hi: self.hi * power, lo: self.lo * power }
    }

    /// Quotient by a whole number below 2^53, within 16 of 2^-106.
    ///
    /// The first quotient is off by 2^-53 of itself, and its residual is exact in a double word; what the second leaves
    /// is 2^-53 of 2^-53, three times, and a rounding.
    #[inline(always)]
    pub(crate) fn over(self, divisor: f64) -> Self {
        let first = self.hi / divisor;
        let product = two_product(first, divisor);
        let rest = (self.hi - product.hi) - product.lo + self.lo;
        quick_two_sum(first, rest / divisor)
    }
}

impl Neg for DoubleWord {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

/// All numbers within `radius` of a midpoint. Not a number anywhere in it means that nothing is known: all numbers.
///
/// # Example
/// ```
/// use penetrode::physics::ball::Ball;
/// use penetrode::physics::Scalar;
///
/// // One tenth, as a decimal: no f64.
/// let tenth = Ball::decimal(0.1);
/// let (low, high) = (tenth * tenth * Ball::from_f64(100.0)).interval();
/// assert!(low <= 1.0 && 1.0 <= high && high - low <= 4.0 * f64::EPSILON);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ball {
    pub(crate) mid: DoubleWord,
    pub(crate) radius: f64,
}

impl Ball {
    /// Around `mid`, `radius` far.
    pub(crate) fn around(mid: DoubleWord, radius: f64) -> Self {
        Self { mid, radius }
    }

    /// Everything from `low` to `high`.
    pub fn between(low: f64, high: f64) -> Self {
        if low == 0.0 && high > 4.0 * TINY {
            return Self { mid: DoubleWord::of(0.5 * high), radius: 0.5 * high };
        }
        // Twice the rounding of the middle and of each difference.
        let middle = 0.5 * low + 0.5 * high;
        let radius = (high - middle).max(middle - low) * UP + TINY;
        let radius = if low == high { 0.0 } else { radius };
        Self { mid: DoubleWord::of(if low == high { low } else { middle }), radius }
    }

    /// Everything in this ball, in `other`, and between them.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        let ((a, b), (c, d)) = (self.interval(), other.interval());
        Self::between(a.min(c), b.max(d))
    }

    /// The whole number `digits`; nothing is known of one beyond 2^126.
    pub fn whole(digits: i128) -> Self {
        if digits.unsigned_abs() > 1 << 126 {
            return Self::from_f64(f64::NAN);
        }
        let hi = digits as f64;
        let rest = digits.saturating_sub(hi as i128);
        let lo = rest as f64;
        let left = rest.saturating_sub(lo as i128).unsigned_abs() as f64;
        Self { mid: quick_two_sum(hi, lo), radius: left * UP }
    }

    /// The decimal `digits 10^exponent`.
    pub fn of_decimal(digits: i128, exponent: i64) -> Self {
        if digits == 0 {
            return Self::zero();
        }
        if exponent.unsigned_abs() > 400 {
            return Self::from_f64(f64::NAN);
        }
        let power = (0..exponent.unsigned_abs()).fold(Self::one(), |power, _| power * Self::whole(10));
        if exponent < 0 { Self::whole(digits) / power } else { Self::whole(digits) * power }
    }

    /// Least and greatest `f64` beside it: it lies between them, and no narrower pair of which that is known.
    pub fn interval(self) -> (f64, f64) {
        (-(-self).upper(), self.upper())
    }

    /// A number that is not below it.
    #[inline]
    pub fn upper(self) -> f64 {
        let tail = self.mid.lo + self.radius;
        // The sum is exact if one of both is zero; else rounded, by less than a spacing.
        let tail = if self.radius == 0.0 || self.mid.lo == 0.0 { tail } else { tail.next_up() };
        let DoubleWord { hi, lo } = two_sum(self.mid.hi, tail);
        let upper = if lo > 0.0 { hi.next_up() } else { hi };
        if upper.is_nan() || lo.is_nan() { f64::INFINITY } else { upper }
    }

    /// A number that is not above it.
    #[inline]
    pub fn lower(self) -> f64 {
        -(-self).upper()
    }

    /// A number that is not below its absolute value.
    #[inline]
    pub fn magnitude(self) -> f64 {
        let bound = (self.mid.hi.abs() + self.mid.lo.abs() + self.radius) * UP;
        if bound.is_nan() { f64::INFINITY } else { bound }
    }

    /// The same midpoint, `more` added to the radius.
    #[inline]
    #[must_use]
    pub fn widened(self, more: f64) -> Self {
        Self { radius: (self.radius + more) * UP, ..self }
    }

    /// Product with a power of two.
    #[inline]
    #[must_use]
    pub(crate) fn scaled(self, power: f64) -> Self {
        Self { mid: self.mid.scaled(power), radius: self.radius * power.abs() }
    }
}

impl Neg for Ball {
    type Output = Self;

    fn neg(self) -> Self {
        Self { mid: -self.mid, ..self }
    }
}

impl Add for Ball {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        if other.is_zero() {
            return self;
        }
        if self.is_zero() {
            return other;
        }
        let mid = self.mid.plus(other.mid);
        let is_exact = self.mid.lo == 0.0 && other.mid.lo == 0.0;
        let rounding = if is_exact { 0.0 } else { mid.hi.abs() * UNIT + TINY };
        Self { mid, radius: (self.radius + other.radius + rounding) * UP }
    }
}

impl Sub for Ball {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Ball {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        let is_finite = |ball: Self| ball.magnitude() < f64::INFINITY;
        if (self.is_zero() && is_finite(other)) || (other.is_zero() && is_finite(self)) {
            return Self::default();
        }
        let mid = self.mid.times(other.mid);
        let is_exact = self.mid.lo == 0.0
            && other.mid.lo == 0.0
            && (mid.hi.abs() > 1e-250 || self.mid.hi == 0.0 || other.mid.hi == 0.0);
        let rounding = if is_exact { 0.0 } else { mid.hi.abs() * UNIT + TINY };
        if self.radius == 0.0 && other.radius == 0.0 {
            return Self { mid, radius: rounding };
        }
        let (a, b) = (self.magnitude(), other.magnitude());
        Self { mid, radius: (a * other.radius + b * self.radius + rounding + TINY) * UP }
    }
}

impl Div for Ball {
    type Output = Self;

    /// Whatever the quotient of the midpoints is, its residual says how far off it is.
    fn div(self, other: Self) -> Self {
        let least = (other.mid.hi.abs() * (1.0 - UNIT.sqrt()) - other.radius * UP) / UP;
        if self.is_zero() && least > 0.0 {
            return self;
        }
        let first = self.mid.hi / other.mid.hi;
        let (dividend, divisor) = (Self::around(self.mid, 0.0), Self::around(other.mid, 0.0));
        let rest = dividend - divisor * Self::from_f64(first);
        let mid = quick_two_sum(first, rest.mid.hi / other.mid.hi);
        let residual = dividend - divisor * Self::around(mid, 0.0);
        let quotient = mid.hi.abs() * UP;
        let is_exact = self.radius == 0.0 && other.radius == 0.0 && residual.is_zero();
        let underflow = if is_exact && mid.hi.abs() > 1e-250 { 0.0 } else { TINY };
        let error = (residual.magnitude() + self.radius + quotient * other.radius) * UP / least * UP + underflow;
        Self { mid, radius: if least > 0.0 && error.is_finite() { error } else { f64::INFINITY } }
    }
}

impl AddAssign for Ball {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Ball {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Scalar for Ball {
    const EPSILON: f64 = UNIT;

    fn from_f64(value: f64) -> Self {
        Self { mid: DoubleWord::of(value), radius: 0.0 }
    }

    fn value(self) -> f64 {
        self.mid.hi
    }

    /// Nothing is known of the root of a ball that reaches below zero.
    fn sqrt(self) -> Self {
        let (low, high) = self.interval();
        if !(low >= 0.0) {
            return Self::from_f64(f64::NAN);
        }
        if self.is_zero() {
            return self;
        }
        if low <= 0.0 {
            return Self::between(0.0, (high.sqrt() * UP).max(TINY));
        }
        let first = self.mid.hi.sqrt();
        let radicand = Self::around(self.mid, 0.0);
        let rest = radicand - Self::from_f64(first) * Self::from_f64(first);
        let mid = quick_two_sum(first, rest.mid.hi / (2.0 * first));
        let root = Self::around(mid, 0.0);
        // |sqrt(m) - y| = |m - y²|/(sqrt(m) + y), and |sqrt(m + r) - sqrt(m)| <= r/sqrt(m).
        let least = mid.hi / UP;
        let residual = (radicand - root * root).magnitude() * UP / least * UP;
        let error = (residual + self.radius / least) * UP;
        // With a midpoint that is a root to 12 digits, sqrt(mc) is no less than mid/UP.
        Self { mid, radius: if residual < mid.hi * (UP - 1.0) { error } else { f64::INFINITY } }
    }

    fn decimal(value: f64) -> Self {
        match super::units::decimal(&format!("{value:e}")) {
            Some((digits, exponent)) => Self::of_decimal(digits, exponent),
            None => Self::from_f64(value),
        }
    }

    fn literal(value: f64, short: bool) -> Self {
        match value {
            _ if !short => Self::from_f64(value).widened(f64::EPSILON * value.abs()),
            std::f64::consts::PI => Self::quarter_pi().scaled(4.0),
            std::f64::consts::E => Elementary::exp(Self::one()),
            _ => Self::decimal(value),
        }
    }

    fn is_zero(self) -> bool {
        self == Self::default()
    }

    const HAS_RANGE: bool = true;

    fn is_not_negative(self) -> bool {
        self.lower() >= 0.0
    }

    fn not_negative(self) -> Self {
        if self.lower() >= 0.0 { self } else { Self::between(0.0, self.upper().max(0.0)) }
    }

    /// Everything in both where the sign is open.
    fn select(self, above: Self, below: Self) -> Self {
        if self.lower() >= 0.0 {
            above
        } else if self.upper() < 0.0 {
            below
        } else {
            above.hull(below)
        }
    }

    fn is_constant(self) -> bool {
        self.radius == 0.0 && self.mid.lo == 0.0
    }

    fn quarter_pi() -> Self {
        // 0.785398163397448309615660845819875721049292349843776455243736..., to 2^-107 of itself.
        let mid = DoubleWord { hi: std::f64::consts::FRAC_PI_4, lo: 3.061_616_997_868_383e-17 };
        Self { mid, radius: 1e-32 }
    }
}

/// Terms of the series of e^z, sin z and cos z, for |z| <= 1/64.
const TERMS: usize = 20;

/// Halvings that bring numbers up to 2^12 to 1/64.
const HALVINGS_MAX: i32 = 18;

impl Ball {
    /// How often to halve it, to have a series that converges fast.
    fn halvings(self) -> i32 {
        let size = self.magnitude() * 64.0;
        if size <= 1.0 { 0 } else { (size.log2().ceil() as i32).min(HALVINGS_MAX) }
    }

    /// The sum of `z^k/k!` over every k from `first` in steps of `step`, with signs that alternate where `step` is two.
    fn exponential_series(self, first: usize, step: usize) -> Self {
        let (mut term, mut sum) = (Self::one(), Self::zero());
        for k in 0..TERMS {
            if k > 0 {
                term = term * self / Self::from_f64(k as f64);
            }
            if k >= first && (k - first).is_multiple_of(step) {
                let is_minus = step == 2 && (k - first) % 4 == 2;
                sum += if is_minus { -term } else { term };
            }
        }
        // The terms left out are a sixty-fourth of each other at most.
        if self.magnitude() <= 1.0 { sum.widened(term.magnitude()) } else { Self::from_f64(f64::NAN) }
    }

    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self) {
        let halvings = self.halvings();
        let z = self.scaled(0.5_f64.powi(halvings));
        let (mut sin, mut cos) = (z.exponential_series(1, 2), z.exponential_series(0, 2));
        for _ in 0..halvings {
            (sin, cos) = ((sin * cos).scaled(2.0), cos * cos - sin * sin);
        }
        (sin, cos)
    }
}

impl Elementary for Ball {
    fn exp(self) -> Self {
        let halvings = self.halvings();
        let mut power = self.scaled(0.5_f64.powi(halvings)).exponential_series(0, 1);
        for _ in 0..halvings {
            power = power * power;
        }
        power
    }

    fn ln(self) -> Self {
        if self.lower() <= 0.0 {
            return Self::from_f64(f64::NAN);
        }
        // ln z = y + ln(1 + w) with any y near it: w - w²/2 + w³/3, and less than w⁴ behind.
        let near = Self::from_f64(self.mid.hi.ln());
        let w = self * (-near).exp() - Self::one();
        let size = w.magnitude();
        if !(size < 0.5) {
            let (low, high) = self.interval();
            // d ln z is between those at the ends.
            return if low == high || self.radius == 0.0 {
                Self::from_f64(f64::NAN)
            } else {
                Self::from_f64(low).ln().hull(Self::from_f64(high).ln())
            };
        }
        let series = w * (Self::one() - w * (Self::from_f64(0.5) - w / Self::from_f64(3.0)));
        (near + series).widened(size * size * size * size)
    }

    fn ln_1p(self) -> Self {
        let size = self.magnitude();
        if size < LOGARITHM_BY_SERIES {
            // Less than the next term and those of a geometric series behind it.
            return logarithm_by_series(self).widened(size.powi(TERMS_OF_LOGARITHM + 1));
        }
        Elementary::ln(Self::one() + self)
    }

    fn log10(self) -> Self {
        Elementary::ln(self) / Elementary::ln(Self::from_f64(10.0))
    }

    fn sin(self) -> Self {
        self.sin_cos().0
    }

    fn cos(self) -> Self {
        self.sin_cos().1
    }

    fn tanh(self) -> Self {
        // It rises with z: a wide ball has the values at its ends.
        if self.radius > 0.25 && self.radius.is_finite() {
            let (low, high) = self.interval();
            return Self::from_f64(low).tanh().hull(Self::from_f64(high).tanh());
        }
        let twice = Elementary::exp(self.scaled(-2.0 * self.mid.hi.signum()));
        let tanh = (Self::one() - twice) / (Self::one() + twice);
        if self.mid.hi < 0.0 { -tanh } else { tanh }
    }

    fn atan(self) -> Self {
        // The angle between it and any y near it has the tangent (z - tan y)/(1 + z tan y).
        let near = Self::from_f64(self.mid.hi.atan().clamp(-FRAC_PI_2, FRAC_PI_2));
        let (sin, cos) = near.sin_cos();
        let below = cos + self * sin;
        let w = (self * cos - sin) / below;
        let size = w.magnitude();
        if size < 0.5 && below.lower() > 0.0 {
            (near + w * (Self::one() - w * w / Self::from_f64(3.0))).widened(size * size * size * size * size)
        } else {
            Self::between(-1.6, 1.6)
        }
    }

    /// Nothing is known of the powers of a ball that reaches below zero.
    fn powf(self, exponent: Self) -> Self {
        let power = |base: Self| Elementary::exp(Elementary::ln(base) * exponent);
        let (low, high) = self.interval();
        if low == 0.0 && exponent.lower() > 0.0 {
            return if high > 0.0 { Self::between(0.0, power(Self::from_f64(high)).upper()) } else { Self::zero() };
        }
        power(self)
    }

    fn with_slope(self, value: Self, _slope: impl FnOnce() -> f64) -> Self {
        value
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use dashu_float::FBig;
    use dashu_float::round::mode::HalfEven;

    use super::*;
    use crate::testing::Random;

    type Big = FBig<HalfEven, 2>;

    fn big(value: f64) -> Big {
        Big::try_from(value).unwrap().with_precision(600).value()
    }

    fn middle(ball: Ball) -> Big {
        big(ball.mid.hi) + big(ball.mid.lo)
    }

    fn distance(a: &Big, b: &Big) -> Big {
        if a < b { b - a } else { a - b }
    }

    /// A ball, and a number in it.
    fn drawn(random: &mut Random) -> (Ball, Big) {
        let size = random.log_uniform(1e-9, 1e9) * if random.chance(0.5) { 1.0 } else { -1.0 };
        let mut ball = Ball::from_f64(size);
        if random.chance(0.8) {
            ball = ball / Ball::from_f64(random.log_uniform(1.0, 1e3));
        }
        if random.chance(0.5) {
            ball = ball.widened(random.log_uniform(1e-34, 1e-3) * size.abs());
        }
        let inside = middle(ball) + big(ball.radius) * big(random.uniform(-1.0, 1.0));
        (ball, inside)
    }

    #[test]
    fn every_result_holds_what_numbers_of_its_operands_give() {
        let random = &mut Random::new(7);
        let (mut nearest, mut exact) = (0.0_f64, 0);
        for _ in 0..20_000 {
            let ((a, in_a), (b, in_b)) = (drawn(random), drawn(random));
            let root = if in_a > Big::ZERO { Some((a.sqrt(), in_a.clone().sqrt())) } else { None };
            let results = [
                (a + b, in_a.clone() + in_b.clone()),
                (a - b, in_a.clone() - in_b.clone()),
                (a * b, in_a.clone() * in_b.clone()),
                (a / b, in_a.clone() / in_b.clone()),
            ];
            for (ball, inside) in results.into_iter().chain(root) {
                if ball.radius == f64::INFINITY {
                    continue;
                }
                let far = distance(&middle(ball), &inside);
                assert!(far <= big(ball.radius), "{inside} is not in {ball:?}, of {a:?} and {b:?}");
                let (low, high) = ball.interval();
                assert!(big(low) <= inside && inside <= big(high), "{inside} is not between {low} and {high}");
                if ball.radius > 0.0 && a.radius == 0.0 && b.radius == 0.0 {
                    nearest = nearest.max((far / big(ball.radius)).to_f64().value());
                }
                exact += usize::from(ball.radius == 0.0);
            }
        }
        // Neither is a bound far too wide, nor is every operation inexact.
        assert!(nearest > 0.02 && exact > 100, "{nearest} {exact}");
    }

    /// mpmath, 40 digits.
    #[test]
    fn functions_hold_their_values() {
        let cases: [(Ball, &str); 11] = [
            (Elementary::exp(Ball::decimal(-3.7)), "0.0247235264703393912027573829834026293"),
            (Elementary::exp(Ball::decimal(41.3)), "863698375211744030.739264471924966797"),
            (Elementary::ln(Ball::decimal(0.0007)), "-7.2644302229208694309666130752942771"),
            (Elementary::ln_1p(Ball::decimal(0.0007)), "0.00069975511427334192773692436514632782"),
            (Elementary::ln_1p(Ball::decimal(0.7)), "0.53062825106217039623154316318876233"),
            (Elementary::sin(Ball::decimal(21.7)), "0.287052651327727771011170646739079869"),
            (Elementary::cos(Ball::decimal(21.7)), "-0.957914805901715848378263695053676037"),
            (Elementary::tanh(Ball::decimal(-0.3)), "-0.291312612451590905818221272823765928"),
            (Elementary::atan(Ball::decimal(-17.0)), "-1.51204050407917392632913838918797966"),
            (Elementary::powf(Ball::decimal(36.0), Ball::decimal(-0.5)), "0.166666666666666666666666666666666667"),
            (Scalar::quarter_pi(), "0.785398163397448309615660845819875721"),
        ];
        for (ball, digits) in cases {
            let (digits, exponent) = crate::physics::units::decimal(digits).unwrap();
            let exact = Ball::of_decimal(digits, exponent);
            let far = (Ball::around(ball.mid, 0.0) - Ball::around(exact.mid, 0.0)).magnitude();
            assert!(far <= ball.radius + 2.0 * exact.radius, "{ball:?} {exact:?}");
            assert!(ball.radius <= 1e-24 * ball.magnitude(), "{ball:?}");
        }
    }

    /// Between its values at the ends: tanh 3 = 0.9950547536867305.
    #[test]
    fn tanh_of_a_wide_ball_lies_between_those_of_its_ends() {
        let (low, high) = Elementary::tanh(Ball::between(-40.0, 3.0)).interval();
        assert!((-1.0 - 1e-11..=-1.0).contains(&low), "{low}");
        assert!((0.995_054_753_686_730_4..0.995_054_753_7).contains(&high), "{high}");
    }

    #[test]
    fn what_is_not_known_is_everything() {
        let zero = Ball::between(-1.0, 1.0);
        let everything = (f64::NEG_INFINITY, f64::INFINITY);
        for ball in [Ball::one() / zero, Ball::from_f64(f64::MAX) * Ball::from_f64(2.0), Elementary::ln(zero)] {
            assert_eq!(ball.interval(), everything, "{ball:?}");
        }
        assert_eq!(zero.sqrt().interval(), everything);
        assert_eq!(Ball::between(0.0, 1.0).interval(), (0.0, 1.0));
        assert_eq!(Ball::between(0.0, 4.0).sqrt().interval().0, 0.0);
    }
}
