//! Which power series in time does an expression have, order by order?
//!
//! Coefficient k of each register follows from lower ones of its own and from coefficients up to k of its operands:
//!
//! ```text
//! c = a b        c[k] = sum over i of a[i] b[k-i]
//! q = a/b        q[k] = (a[k] - sum over i < k of q[i] b[k-i])/b[0]
//! s = sqrt u     s[k] = (u[k] - sum over 0 < i < k of s[i] s[k-i])/(2 s[0])
//! w = exp u      k w[k] = sum over i > 0 of (i u[i]) w[k-i];  sine and cosine, tanh and its slope alike
//! g f' = u'      k f[k] g[0] = k u[k] - sum over 0 < i < k of (i f[i]) g[k-i]:  log (g = u), atan (g = 1 + u²)
//! p = u^e        k p[k] u[0] = e sum over i > 0 of (i u[i]) p[k-i] - sum over 0 < i < k of (i p[i]) u[k-i]
//! ```
//!
//! Source: Griewank, Walther (2008), Evaluating Derivatives, 2nd ed., section 13.2.

use smallvec::SmallVec;

use super::bound::{Bound, Step, Value};
use super::parse::Function;
use crate::physics::lanes::Lanes;
use crate::physics::scalar::{Scalar, reciprocal};

/// Power series in time of the registers of a [`Bound`] expression, one order more with each [`Jets::push`].
///
/// # Example
/// ```
/// use penetrode::physics::expression::{Jets, Known, Tape};
/// use penetrode::physics::units::Dimension;
///
/// // x = 2 t + t², V = x' = 2 + 2 t: V² = 4 + 8 t + 4 t².
/// let known = [Known { name: "Q", value: 1.0, unit: Dimension::Drag.into() }];
/// let force = Tape::read("Q*V^2", &known, Dimension::Force.into())?.bind(&[1.0]);
/// let mut jets = Jets::default();
/// jets.start(&force, &[]);
/// let coefficients = [(0.0, 2.0), (2.0, 2.0), (1.0, 0.0), (0.0, 0.0)].map(|(x, v)| jets.push(&force, x, v));
/// assert_eq!(coefficients, [4.0, 8.0, 4.0, 0.0]);
/// # Ok::<(), penetrode::physics::expression::ExpressionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Jets<S = f64> {
    /// Coefficients that are there.
    filled: usize,
    /// Of each register.
    coefficients: Vec<[S; ORDERS_MAX]>,
    sides: SmallVec<[bool; 4]>,
    /// How V falls, where that is known.
    falling: Option<Falling>,
}

/// A velocity V (m/s) that falls from V0 in a known way over the variable s of a series, a number without unit (docs/theory.md, section
/// 10).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fall {
    /// `V = V0 (1-s)^m`: to rest at s = 1.
    Power(u32),
    /// `V = V0 e^(-s)`: by the same share over each distance, and never to rest.
    Exponential,
}

impl Fall {
    /// `V/V0` at `s`.
    pub fn left<S: Scalar>(self, s: S) -> S {
        let [left] = self.left_along(&[s]);
        left
    }

    /// `V/V0` at N places, side by side.
    #[inline(always)]
    pub(crate) fn left_along<S: Scalar, const N: usize>(self, s: &[S; N]) -> [S; N] {
        let mut left = [S::one(); N];
        match self {
            Self::Power(m) => {
                for _ in 0..m {
                    left.iter_mut().zip(s).for_each(|(left, s)| *left = *left * (S::one() - *s));
                }
            }
            Self::Exponential => left.iter_mut().zip(s).for_each(|(left, s)| *left = (-*s).exp()),
        }
        left
    }

    /// `(V/V0)^exponent` as a function of s, where it is no root.
    fn power<S: Scalar>(self, exponent: f64) -> Option<impl Fn(S) -> S> {
        let whole = match self {
            Self::Power(m) => exponent * f64::from(m),
            Self::Exponential => 0.0,
        };
        let size = whole.abs() as i32;
        (!exponent.is_nan() && f64::from(size) == whole.abs()).then_some(move |s: S| match self {
            Self::Exponential => (s * S::from_f64(-exponent)).exp(),
            Self::Power(_) => {
                let power = (0..size).fold(S::one(), |power, _| power * (S::one() - s));
                if whole < 0.0 { S::one().over(power) } else { power }
            }
        })
    }

    /// `-d(V/V0)/ds` at `s`.
    pub fn slope<S: Scalar>(self, s: S) -> S {
        match self {
            Self::Power(m) => S::from_f64(f64::from(m)) * Self::Power(m.saturating_sub(1)).left(s),
            Self::Exponential => self.left(s),
        }
    }

    /// Coefficient `k`, above 0, of `V^exponent`, from the one `before`.
    #[inline(always)]
    pub fn coefficient<S: Scalar>(self, k: usize, exponent: f64, before: S) -> S {
        // As a quotient: a factor of one is one.
        let factor = match self {
            Self::Power(m) => k as f64 - 1.0 - exponent * f64::from(m),
            Self::Exponential => -exponent,
        };
        before * S::from_f64(factor).over(S::from_f64(k as f64))
    }

    /// Coefficient `k`, above 0, of the logarithm of `V^exponent`.
    fn of_logarithm<S: Scalar>(self, k: usize, exponent: f64) -> S {
        match self {
            Self::Power(m) => S::from_f64(-exponent * f64::from(m)).over(S::from_f64(k as f64)),
            Self::Exponential if k == 1 => S::from_f64(-exponent),
            Self::Exponential => S::zero(),
        }
    }
}

/// How V falls, and what that makes of the registers of an expression ([`Bound::falling`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Falling {
    /// In which way the expression is smooth.
    pub fall: Fall,
    /// e of each register that is a constant times `V^e`; NaN for others.
    pub(super) powers: SmallVec<[f64; 16]>,
}

/// Most coefficients of a series.
const ORDERS_MAX: usize = 48;

impl<S: Scalar> Default for Jets<S> {
    fn default() -> Self {
        Self { filled: 0, coefficients: Vec::new(), sides: SmallVec::new(), falling: None }
    }
}

impl<S: Scalar> Jets<S> {
    /// Most coefficients of a series.
    pub const ORDERS_MAX: usize = ORDERS_MAX;

    /// Begins new series, on these `sides` of [`Bound::switches`] all along. Allocates for more registers than ever before.
    pub fn start(&mut self, bound: &Bound<S>, sides: &[bool]) {
        debug_assert_eq!(sides.len(), bound.switches().len());
        self.filled = 0;
        self.coefficients.resize(bound.registers(), [S::zero(); ORDERS_MAX]);
        self.sides.clear();
        self.sides.extend_from_slice(sides);
        self.falling = None;
    }

    /// As [`Jets::start`], for a velocity that falls as `falling` says; [`Jets::push`] must be given its coefficients.
    ///
    /// Of a power of V each coefficient is then a multiple of the one before, and of its logarithm each is known. The recurrences
    /// for any series would lose digits here: they cancel.
    pub fn start_falling(&mut self, bound: &Bound<S>, sides: &[bool], falling: &Falling) {
        self.start(bound, sides);
        self.falling = Some(falling.clone());
    }

    /// Coefficients of `register` so far, from order 0. Registers 0 and 1 are x and V.
    pub fn register(&self, register: usize) -> &[S] {
        &self.coefficients[register][..self.filled]
    }

    /// Takes the next coefficients of x and V and gives that of the expression.
    ///
    /// Not finite where there is no series, as [`Bound::explain_series`] says, or where coefficients overflow: in a unit of
    /// time near the distance of the nearest pole they do not.
    ///
    /// # Panics
    /// If there are [`Jets::ORDERS_MAX`] coefficients already, or `bound` is not the expression of [`Jets::start`].
    pub fn push(&mut self, bound: &Bound<S>, x: S, v: S) -> S {
        self.push_in_place(bound, x, v)
    }

    /// As [`Jets::push`], with the instructions of the caller.
    #[inline(always)]
    pub(crate) fn push_in_place(&mut self, bound: &Bound<S>, x: S, v: S) -> S {
        let k = self.filled;
        assert!(k < ORDERS_MAX, "the series has its {ORDERS_MAX} coefficients");
        self.filled += 1;
        let signed = |register, value| if k == 0 { bound.signed(register, value) } else { value };
        self.coefficients[0][k] = signed(0, x);
        self.coefficients[1][k] = signed(1, v);
        let mut place = 2;
        for step in bound.steps() {
            let (done, rest) = self.coefficients.split_at_mut(place);
            let (first, second) = match *step {
                Step::Select { index, switch, above, below, .. } => {
                    let chosen = done[if self.sides[index] { above } else { below }][k];
                    // A switch without a value has no sides.
                    (if k == 0 { done[switch][0].select(chosen, chosen) } else { chosen }, S::zero())
                }
                _ if k == 0 => {
                    let (first, second) = step.values::<_, true>(|register| done[register][0], |constant| constant);
                    let behind = place + step.width() - 1;
                    (bound.signed(place, first), bound.signed(behind, second))
                }
                _ if let Some(falling) = &self.falling
                    && let Some((first, order)) = falling.coefficient(step, place, k, rest[0][k - 1]) =>
                {
                    (first, first * order)
                }
                _ => step.coefficients(k, done, rest),
            };
            rest[0][k] = first;
            place += 1;
            if step.width() == 2 {
                rest[1][k] = second;
                place += 1;
            }
        }
        match bound.result() {
            Value::Register(register) => self.coefficients[register][k],
            Value::Constant(constant) if k == 0 => constant,
            Value::Constant(_) => S::zero(),
        }
    }
}

impl Jets {
    /// One lane of `others`, series of the same expression: the first coefficient of each register, and all of those that are `kept`.
    pub(crate) fn take_lane<const N: usize>(
        &mut self,
        others: &Jets<Lanes<N>>,
        lane: usize,
        kept: impl Iterator<Item = usize>,
    ) {
        self.filled = others.filled;
        self.coefficients.resize(others.coefficients.len(), [0.0; ORDERS_MAX]);
        for (own, of_all) in self.coefficients.iter_mut().zip(&others.coefficients) {
            own[0] = of_all[0].0[lane];
        }
        for register in kept {
            let of_all = &others.coefficients[register][..others.filled];
            self.coefficients[register].iter_mut().zip(of_all).for_each(|(own, of_all)| *own = of_all.0[lane]);
        }
    }
}

impl Falling {
    /// Whether it is the same of another problem.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let is_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        self.fall == other.fall && self.powers.iter().zip(&other.powers).all(is_same)
    }

    /// Fills in the values of a `step` at the places `s` from the one at the `start`, s = 0, and says whether it did: of a power of V that
    /// is no root in s, and of its logarithm.
    pub(super) fn fill_along<S: Scalar, const N: usize>(
        &self,
        step: &Step<S>,
        place: usize,
        s: &[S; N],
        start: impl FnOnce() -> S,
        values: &mut [S; N],
    ) -> bool {
        match *step {
            Step::Power { .. } => {
                let Some(power) = self.fall.power(self.powers[place]) else { return false };
                let start = start();
                *values = s.map(|s| start * power(s));
            }
            Step::Integral { function: Function::Log | Function::Log10, a, factor, .. } => {
                let degree = self.powers[a];
                if !(degree == 0.0 || self.fall == Fall::Exponential && !degree.is_nan()) {
                    return false;
                }
                let (start, slope) = (start(), factor * S::from_f64(-degree));
                *values = s.map(|s| start + slope * s);
            }
            _ => return false,
        }
        true
    }

    /// Coefficient `k` of a `step` whose series V decides alone, from the one `before`, and its order.
    #[inline(always)]
    fn coefficient<S: Scalar>(&self, step: &Step<S>, place: usize, k: usize, before: S) -> Option<(S, S)> {
        let order = S::from_f64(k as f64);
        let power = self.powers[place];
        if !power.is_nan() {
            return Some((self.fall.coefficient(k, power, before), order));
        }
        match *step {
            Step::Integral { function: Function::Log | Function::Log10, a, factor, .. } if !self.powers[a].is_nan() => {
                Some((factor * self.fall.of_logarithm(k, self.powers[a]), order))
            }
            _ => None,
        }
    }
}

impl<S: Scalar> Step<S> {
    /// Coefficients of order `k`, above 0, of its registers, from those of registers before them and lower ones of their `own`.
    ///
    /// The second of two registers begins with what the first one's recurrence is multiplied by.
    #[inline(always)]
    fn coefficients(&self, k: usize, before: &[[S; ORDERS_MAX]], own: &[[S; ORDERS_MAX]]) -> (S, S) {
        let (zero, order, inverse) = (S::zero(), S::from_f64(k as f64), reciprocal::<S>(k));
        let series = |register: usize| &before[register];
        match *self {
            // A branch is chosen by whoever knows the sides.
            Self::Constant { .. } | Self::Select { .. } => (zero, zero),
            Self::Affine { a, factor, .. } => (series(a)[k] * factor, zero),
            Self::Sum { a, b, factor } => (series(a)[k] + series(b)[k] * factor, zero),
            Self::Share { a, inverse, .. } => (series(a)[k] * inverse, zero),
            Self::Multiply { a, b } | Self::HalfPower { whole: a, root: b, .. } => {
                let (a, b) = (series(a), series(b));
                (a[0] * b[k] + a[k] * b[0] + inner(a, b, k), zero)
            }
            Self::Square { a } => {
                let a = series(a);
                let ends = a[0] * a[k];
                (ends + ends + inner_square(a, k), zero)
            }
            Self::Divide { a, b } => {
                let (a, b) = (series(a), series(b));
                ((a[k] - own[0][0] * b[k] - inner(&own[0], b, k)) * own[1][0], zero)
            }
            Self::Ratio { b, .. } => {
                let b = series(b);
                (-(own[0][0] * b[k] + inner(&own[0], b, k)) * own[1][0], zero)
            }
            Self::Slope { a } => (order * series(a)[k], zero),
            // A root or power of nothing is nothing, where it has a value.
            Self::Sqrt { a } | Self::Power { a, .. }
                if own[0][0].is_zero() && series(a)[..=k].iter().all(|c| c.is_zero()) =>
            {
                (zero, zero)
            }
            Self::Sqrt { a } => ((series(a)[k] - inner_square(&own[0], k)) * own[1][0], zero),
            Self::Power { a, slope, exponent } => {
                let (a, slope, slopes) = (series(a), series(slope), &own[1]);
                // A whole power of a series that begins with t begins with that power of t.
                let is_late = exponent.value() > k as f64 && exponent.value().fract() == 0.0;
                if a[0].is_zero() && is_late && exponent.is_constant() {
                    return (zero, zero);
                }
                let sum = exponent * (slope[k] * own[0][0] + inner(slope, &own[0], k)) - inner(slopes, a, k);
                let scaled = sum * slopes[0];
                (scaled * inverse, scaled)
            }
            Self::Exp { slope, .. } => (inverse * integrand(series(slope), &own[0], k), zero),
            Self::SinCos { slope, .. } => {
                let slope = series(slope);
                (inverse * integrand(slope, &own[1], k), -(inverse * integrand(slope, &own[0], k)))
            }
            Self::Tanh { slope, .. } => {
                let next = inverse * integrand(series(slope), &own[1], k);
                let ends = own[0][0] * next;
                (next, -(ends + ends + inner_square(&own[0], k)))
            }
            Self::Integral { slope, divisor, factor, .. } => {
                let (slope, divisor) = (series(slope), series(divisor));
                let sum = factor * slope[k] - inner(&own[1], divisor, k);
                let scaled = sum * own[1][0];
                (scaled * inverse, scaled)
            }
        }
    }
}

/// The sum over 0 < i <= k of `slope[i] factor[k-i]`.
#[inline(always)]
fn integrand<S: Scalar>(slope: &[S; ORDERS_MAX], factor: &[S; ORDERS_MAX], k: usize) -> S {
    slope[k] * factor[0] + inner(slope, factor, k)
}

/// The sum over 0 < i < k of `a[i] b[k-i]`.
///
/// Without the ends, so that it reads no coefficient of this order: two numbers read at once, one of which was just
/// written, wait for the writing.
#[inline(always)]
fn inner<S: Scalar>(a: &[S; ORDERS_MAX], b: &[S; ORDERS_MAX], k: usize) -> S {
    product(&a[1..k], &b[1..k])
}

/// As [`inner`], of a series with itself: each pair once.
#[inline(always)]
fn inner_square<S: Scalar>(a: &[S; ORDERS_MAX], k: usize) -> S {
    let half = (k - 1) / 2;
    let pairs = product(&a[1..=half], &a[k - half..k]);
    let middle = if k.is_multiple_of(2) { a[k / 2] * a[k / 2] } else { S::zero() };
    pairs + pairs + middle
}

/// The sum over i of `a[i] b[n-1-i]`, of two slices of the length n.
#[inline(always)]
pub(crate) fn product<S: Scalar>(a: &[S], b: &[S]) -> S {
    let (a_fours, a_rest) = a.as_chunks::<4>();
    let (b_rest, b_fours) = b.as_rchunks::<4>();
    // Four sums at once: each waits for its last product, none for another.
    let mut sums = [S::zero(); 4];
    for (a, b) in a_fours.iter().zip(b_fours.iter().rev()) {
        for (index, sum) in sums.iter_mut().enumerate() {
            *sum += a[index] * b[3 - index];
        }
    }
    let mut rest = S::zero();
    for (a, b) in a_rest.iter().zip(b_rest.iter().rev()) {
        rest += *a * *b;
    }
    rest + ((sums[0] + sums[1]) + (sums[2] + sums[3]))
}
