//! An expression with values of its parameters, as steps on registers: for values, and for power series ([`super::Jets`]).
//!
//! What is made of parameters and numbers alone is computed once, and stands in the steps as a constant. A function whose
//! series needs that of another (sine and cosine; tanh and its slope) computes both in one step.

use std::sync::{Arc, OnceLock};

use num_dual::Dual64;
use smallvec::SmallVec;

use super::jets::{Fall, Falling};
use super::parse::{Binary, Function, Term};
use super::tape::{self, DomainError, Tape};
use crate::physics::lanes::Lanes;
use crate::physics::scalar::Scalar;

/// Largest whole exponent that is computed by products, which hold at zero too.
pub(super) const POWER_MAX: f64 = 64.0;

/// Largest exponent `n + 1/2` that is computed by products and a square root.
const HALF_POWER_MAX: f64 = 8.0;

/// Largest common denominator of powers of V for which u is taken as variable.
const ROOT_MAX: u32 = 12;

/// Most numbers of a step.
const NUMBERS_MAX: usize = 2;

/// Registers that a law of the field needs: to set more to zero takes longer than to compute it.
const FEW: usize = 16;

/// Registers that need no allocation.
const MANY: usize = 96;

/// Switches of an expression for whose sides it is kept how V falls.
const SWITCHES_KEPT: usize = 2;

/// An expression with values of its parameters.
#[derive(Clone, Debug)]
pub struct Bound<S = f64> {
    tape: Tape,
    parameters: SmallVec<[S; 8]>,
    steps: Vec<Step<S>>,
    registers: usize,
    switches: SmallVec<[usize; 4]>,
    result: Value<S>,
    /// The value of the second expression, if there is one.
    beside: Option<Value<S>>,
    /// Whether each register is known not to be negative, whatever x and V are.
    signs: Vec<bool>,
    /// Whether the value is known not to fall with V, at any depth.
    never_falls_with_v: bool,
    /// How V falls over a step, for the sides of up to [`SWITCHES_KEPT`] switches.
    falling: [OnceLock<Arc<Falling>>; 1 << SWITCHES_KEPT],
}

/// What a term became.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<S> {
    Constant(S),
    Register(usize),
}

impl<S: Copy> Value<S> {
    /// Its values among those of all registers.
    fn among<const N: usize>(self, registers: &[[S; N]]) -> [S; N] {
        match self {
            Self::Constant(constant) => [constant; N],
            Self::Register(register) => registers[register],
        }
    }
}

/// What is computed next, of registers by index. The results follow in the next one or two registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step<S> {
    /// A number, where a register is needed.
    Constant {
        value: S,
    },
    /// `factor a + shift`.
    Affine {
        a: usize,
        factor: S,
        shift: S,
    },
    /// `a + factor b`.
    Sum {
        a: usize,
        b: usize,
        factor: S,
    },
    /// `a/divisor`; a series is multiplied by the `inverse`, which is faster and an ulp apart.
    Share {
        a: usize,
        divisor: S,
        inverse: S,
    },
    Multiply {
        a: usize,
        b: usize,
    },
    Square {
        a: usize,
    },
    /// `a/b`, and `1/b`.
    Divide {
        a: usize,
        b: usize,
    },
    /// `dividend/b`, and `1/b`.
    Ratio {
        dividend: S,
        b: usize,
    },
    /// The series whose coefficient k is k times that of `a`.
    Slope {
        a: usize,
    },
    /// `sqrt a`, and `1/(2 sqrt a)`.
    Sqrt {
        a: usize,
    },
    /// `a^exponent`, the product of `whole`, which is `a^n`, and `root`, which is `sqrt a`.
    HalfPower {
        a: usize,
        whole: usize,
        root: usize,
        exponent: f64,
    },
    /// `a^exponent`, and the slope of it, whose coefficient 0, no other than zero, is `1/a` in its place.
    Power {
        a: usize,
        slope: usize,
        exponent: S,
    },
    Exp {
        a: usize,
        slope: usize,
    },
    /// `sin a` and `cos a`.
    SinCos {
        a: usize,
        slope: usize,
    },
    /// `tanh a` and `1 - tanh² a`.
    Tanh {
        a: usize,
        slope: usize,
    },
    /// A function f with `divisor f' = factor a'`, and the slope of it, with `1/divisor` as coefficient 0. Where a is one and something
    /// `less_one`, its logarithm is made of that, which 1 would hide.
    Integral {
        function: Function,
        a: usize,
        less_one: Option<usize>,
        slope: usize,
        divisor: usize,
        factor: S,
    },
    /// `above` where the register of the switch of this index is not negative, else `below`.
    Select {
        index: usize,
        switch: usize,
        above: usize,
        below: usize,
        /// Whether it is the greater of the two, else the lesser.
        greater: bool,
    },
}

impl<S: Copy> Step<S> {
    /// The same step of other numbers: `number` of each of its own, in one order.
    fn map<T>(self, mut number: impl FnMut(S) -> T) -> Step<T> {
        match self {
            Self::Constant { value } => Step::Constant { value: number(value) },
            Self::Affine { a, factor, shift } => Step::Affine { a, factor: number(factor), shift: number(shift) },
            Self::Sum { a, b, factor } => Step::Sum { a, b, factor: number(factor) },
            Self::Share { a, divisor, inverse } => {
                Step::Share { a, divisor: number(divisor), inverse: number(inverse) }
            }
            Self::Multiply { a, b } => Step::Multiply { a, b },
            Self::Square { a } => Step::Square { a },
            Self::Divide { a, b } => Step::Divide { a, b },
            Self::Ratio { dividend, b } => Step::Ratio { dividend: number(dividend), b },
            Self::Slope { a } => Step::Slope { a },
            Self::Sqrt { a } => Step::Sqrt { a },
            Self::HalfPower { a, whole, root, exponent } => Step::HalfPower { a, whole, root, exponent },
            Self::Power { a, slope, exponent } => Step::Power { a, slope, exponent: number(exponent) },
            Self::Exp { a, slope } => Step::Exp { a, slope },
            Self::SinCos { a, slope } => Step::SinCos { a, slope },
            Self::Tanh { a, slope } => Step::Tanh { a, slope },
            Self::Integral { function, a, less_one, slope, divisor, factor } => {
                Step::Integral { function, a, less_one, slope, divisor, factor: number(factor) }
            }
            Self::Select { index, switch, above, below, greater } => {
                Step::Select { index, switch, above, below, greater }
            }
        }
    }
}

impl<S> Step<S> {
    /// How many registers it fills.
    pub(super) fn width(&self) -> usize {
        match self {
            Self::Divide { .. }
            | Self::Ratio { .. }
            | Self::Sqrt { .. }
            | Self::Power { .. }
            | Self::SinCos { .. }
            | Self::Tanh { .. }
            | Self::Integral { .. } => 2,
            _ => 1,
        }
    }
}

impl<S: Scalar> Step<S> {
    /// The registers that it is computed of, on `sides` of the switches.
    fn operands(&self, sides: &[bool], mut with: impl FnMut(usize)) {
        match *self {
            Self::Constant { .. } => {}
            Self::Affine { a, .. }
            | Self::Share { a, .. }
            | Self::Square { a }
            | Self::Slope { a }
            | Self::Sqrt { a } => {
                with(a);
            }
            Self::Ratio { b, .. } => with(b),
            Self::Sum { a, b, .. } | Self::Multiply { a, b } | Self::Divide { a, b } => {
                [a, b].into_iter().for_each(with);
            }
            Self::HalfPower { a, whole, root, .. } => [a, whole, root].into_iter().for_each(with),
            Self::Power { a, slope, .. }
            | Self::Exp { a, slope }
            | Self::SinCos { a, slope }
            | Self::Tanh { a, slope } => [a, slope].into_iter().for_each(with),
            Self::Integral { a, less_one, slope, divisor, .. } => {
                [a, slope, divisor].into_iter().chain(less_one).for_each(with);
            }
            Self::Select { index, above, below, .. } => with(if sides[index] { above } else { below }),
        }
    }

    /// Values of its registers, the second one only where it has two; a constant enters by `lift`. A quotient that only series need
    /// is left out unless they are asked `FOR_SERIES`.
    #[inline(always)]
    pub(super) fn values<T: Scalar, const FOR_SERIES: bool>(
        &self,
        at: impl Fn(usize) -> T,
        lift: impl Fn(S) -> T,
    ) -> (T, T) {
        let zero = T::zero();
        let inverse = |numerator: f64, divisor: T| {
            if FOR_SERIES { T::from_f64(numerator).over(divisor) } else { zero }
        };
        match *self {
            Self::Constant { value } => (lift(value), zero),
            Self::Affine { a, factor, shift } => (at(a) * lift(factor) + lift(shift), zero),
            Self::Sum { a, b, factor } => (at(a) + at(b) * lift(factor), zero),
            Self::Share { a, divisor, .. } => (at(a).over(lift(divisor)), zero),
            Self::Multiply { a, b } => (at(a) * at(b), zero),
            Self::Square { a } => (at(a) * at(a), zero),
            Self::Divide { a, b } => (at(a).over(at(b)), inverse(1.0, at(b))),
            Self::Ratio { dividend, b } => (lift(dividend).over(at(b)), inverse(1.0, at(b))),
            Self::Slope { .. } => (zero, zero),
            Self::Select { switch, above, below, .. } => (at(switch).select(at(above), at(below)), zero),
            Self::Sqrt { a } => {
                let root = at(a).sqrt();
                (root, inverse(0.5, root))
            }
            Self::HalfPower { a, whole, root, exponent } => {
                // Not by the rule of products, which gives no slope at zero.
                let slope = || exponent * at(a).value().powf(exponent - 1.0);
                (at(a).with_slope(at(whole) * at(root), slope), zero)
            }
            Self::Power { a, exponent, .. } => (at(a).powf(lift(exponent)), inverse(1.0, at(a))),
            Self::Exp { a, .. } => (at(a).exp(), zero),
            Self::SinCos { a, .. } => (at(a).sin(), at(a).cos()),
            Self::Tanh { a, .. } => {
                let value = at(a).tanh();
                (value, T::one() - value * value)
            }
            Self::Integral { function, a, less_one, divisor, .. } => {
                let value = less_one.map_or_else(|| tape::call(function, at(a)), |less| at(less).ln_1p());
                (value, inverse(1.0, at(divisor)))
            }
        }
    }
}

/// Sets each lane of a register.
#[inline(always)]
fn set<S, const N: usize>(register: &mut [S; N], mut value: impl FnMut(usize) -> S) {
    for (lane, of_lane) in register.iter_mut().enumerate() {
        *of_lane = value(lane);
    }
}

/// tanh by one exponential where that loses nothing: a quarter of the time of the function.
fn tanh<S: Scalar>(of: S) -> S {
    let size = of.select(of, -of);
    if size.value() < 0.2 {
        return of.tanh();
    }
    let left = (-(size + size)).exp();
    let value = (S::one() - left).over(S::one() + left);
    of.select(value, -value)
}

/// How a register depends on V.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Degree {
    /// e of `a V^e`, with any a of x; NaN for another function of V.
    of_v: f64,
    /// Whether a is a constant.
    is_plain: bool,
}

impl Degree {
    const NONE: Self = Self { of_v: f64::NAN, is_plain: false };

    fn times(self, other: Self) -> Self {
        Self { of_v: self.of_v + other.of_v, is_plain: self.is_plain && other.is_plain }
    }

    fn to(self, exponent: f64) -> Self {
        Self { of_v: exponent * self.of_v, ..self }
    }

    /// Of a sum or a function: only what V does not touch is a power of it, the zeroth.
    fn of_any(degrees: impl IntoIterator<Item = Self>) -> Self {
        let is_free = degrees.into_iter().all(|degree| degree.of_v == 0.0);
        Self { of_v: if is_free { 0.0 } else { f64::NAN }, is_plain: false }
    }
}

/// The degree of each register, on `sides` of the switches.
fn degrees<S: Scalar>(steps: &[Step<S>], registers: usize, sides: &[bool]) -> SmallVec<[Degree; FEW]> {
    let mut degrees = SmallVec::with_capacity(registers);
    degrees.extend([Degree { of_v: 0.0, is_plain: false }, Degree { of_v: 1.0, is_plain: true }]);
    for step in steps {
        let of = |register: usize| -> Degree { degrees[register] };
        let degree = match *step {
            Step::Constant { .. } => Degree { of_v: 0.0, is_plain: true },
            Step::Affine { a, shift, .. } if shift.value() == 0.0 && shift.is_constant() => of(a),
            Step::Affine { a, .. } => Degree::of_any([of(a)]),
            Step::Share { a, .. } => of(a),
            Step::Slope { .. } => Degree::NONE,
            Step::Sum { a, b, .. } => Degree::of_any([of(a), of(b)]),
            Step::Multiply { a, b } => of(a).times(of(b)),
            Step::Square { a } => of(a).to(2.0),
            Step::Divide { a, b } => of(a).times(of(b).to(-1.0)),
            Step::Ratio { b, .. } => of(b).to(-1.0),
            Step::Sqrt { a } => of(a).to(0.5),
            Step::HalfPower { a, exponent, .. } => of(a).to(exponent),
            Step::Power { a, exponent, .. } => {
                let power = of(a).to(exponent.value());
                Degree { is_plain: power.is_plain && exponent.is_constant(), ..power }
            }
            Step::Select { index, above, below, .. } => of(if sides[index] { above } else { below }),
            Step::Exp { a, .. } | Step::SinCos { a, .. } | Step::Tanh { a, .. } | Step::Integral { a, .. } => {
                Degree::of_any([of(a)])
            }
        };
        degrees.push(degree);
        if step.width() == 2 {
            degrees.push(Degree::NONE);
        }
    }
    degrees
}

/// Whether each register is not negative by what it is made of: x and V, squares, roots and exponentials, and sums and products of
/// such.
fn signs<S: Scalar>(steps: &[Step<S>], registers: usize) -> Vec<bool> {
    let mut signs = Vec::with_capacity(registers);
    signs.extend([true, true]);
    for step in steps {
        let of = |register: usize| signs[register];
        let (first, second) = match *step {
            Step::Constant { value } => (value.is_not_negative(), false),
            Step::Affine { a, factor, shift } => (of(a) && factor.is_not_negative() && shift.is_not_negative(), false),
            Step::Sum { a, b, factor } => (of(a) && of(b) && factor.is_not_negative(), false),
            Step::Share { a, divisor, .. } => (of(a) && divisor.is_not_negative(), false),
            Step::Multiply { a, b } => (of(a) && of(b), false),
            Step::Divide { a, b } => (of(a) && of(b), of(b)),
            Step::Ratio { dividend, b } => (dividend.is_not_negative() && of(b), of(b)),
            Step::Square { .. } | Step::HalfPower { .. } | Step::Exp { .. } => (true, false),
            Step::Sqrt { .. } => (true, true),
            Step::Power { a, .. } | Step::Tanh { a, .. } | Step::Integral { function: Function::Atan, a, .. } => {
                (of(a), false)
            }
            // abs(a) is a or -a, as a is not negative or is.
            Step::Select { switch, above, below, greater, .. } => {
                let is_either = of(above) || of(below) || switch == above;
                (of(above) && of(below) || greater && is_either, false)
            }
            Step::Slope { .. } | Step::SinCos { .. } | Step::Integral { .. } => (false, false),
        };
        signs.push(first);
        if step.width() == 2 {
            signs.push(second);
        }
    }
    signs
}

/// How a value changes with V at one depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Trend {
    Constant,
    Rises,
    Falls,
}

impl Trend {
    fn never_falls(self) -> bool {
        self != Self::Falls
    }

    /// Of what falls as this rises.
    fn turned(self) -> Self {
        match self {
            Self::Constant => Self::Constant,
            Self::Rises => Self::Falls,
            Self::Falls => Self::Rises,
        }
    }

    /// Of a multiple.
    fn times<S: Scalar>(self, factor: S) -> Self {
        if factor.value() < 0.0 { self.turned() } else { self }
    }

    /// Of what rises with both.
    fn with(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Constant, trend) | (trend, Self::Constant) => Some(trend),
            _ => (self == other).then_some(self),
        }
    }
}

/// The trend of each register, x and V not negative; `None` where it is not known.
fn trends<S: Scalar>(steps: &[Step<S>], signs: &[bool]) -> SmallVec<[Option<Trend>; FEW]> {
    let mut trends = SmallVec::with_capacity(signs.len());
    trends.extend([Some(Trend::Constant), Some(Trend::Rises)]);
    for step in steps {
        let place = trends.len();
        let of = |register: usize| -> Option<Trend> { trends[register] };
        let constant = |register: usize| of(register).filter(|trend| *trend == Trend::Constant);
        let both = |a: usize, b: usize| of(a)?.with(of(b)?);
        let turned = |register: usize| of(register).map(Trend::turned);
        let trend = match *step {
            Step::Constant { .. } => Some(Trend::Constant),
            Step::Affine { a, factor, .. } => of(a).map(|trend| trend.times(factor)),
            Step::Share { a, divisor, .. } => of(a).map(|trend| trend.times(divisor)),
            Step::Sum { a, b, factor } => of(a).zip(of(b)).and_then(|(a, b)| a.with(b.times(factor))),
            Step::Multiply { a, b } if signs[a] && signs[b] => both(a, b),
            Step::Divide { a, b } if signs[a] && signs[b] => of(a).zip(turned(b)).and_then(|(a, b)| a.with(b)),
            Step::Multiply { a, b } | Step::Divide { a, b } => constant(a).and(constant(b)),
            Step::Ratio { dividend, b } if signs[b] => turned(b).map(|trend| trend.times(dividend)),
            Step::Square { a } if signs[a] => of(a),
            Step::Power { a, exponent, .. } if signs[a] => of(a).map(|trend| trend.times(exponent)),
            Step::Ratio { b: a, .. } | Step::Square { a } | Step::Power { a, .. } | Step::SinCos { a, .. } => {
                constant(a)
            }
            // Where they have a value, they rise with it.
            Step::Sqrt { a }
            | Step::HalfPower { a, .. }
            | Step::Exp { a, .. }
            | Step::Tanh { a, .. }
            | Step::Integral { a, .. } => of(a),
            Step::Select { switch, above, below, .. } if switch != above => both(above, below),
            Step::Select { above, .. } => constant(above),
            Step::Slope { .. } => None,
        };
        trends.push(trend);
        trends.resize(place + step.width(), None);
    }
    trends
}

impl<S: Scalar> Bound<S> {
    pub(super) fn new(tape: Tape, parameters: &[S]) -> Self {
        Self::of(tape, parameters, None)
    }

    fn of(tape: Tape, parameters: &[S], beside: Option<(&Tape, &[S])>) -> Self {
        let mut making = Making { steps: Vec::with_capacity(tape.terms().len()), ..Making::default() };
        let result = making.value(&tape, parameters);
        let beside = beside.map(|(tape, parameters)| making.value(tape, parameters));
        let Making { steps, registers, switches, .. } = making;
        let signs = signs(&steps, registers);
        let never_falls_with_v = match result {
            Value::Constant(_) => true,
            Value::Register(register) => trends(&steps, &signs)[register].is_some_and(Trend::never_falls),
        };
        let parameters = parameters.iter().copied().collect();
        Self {
            tape,
            parameters,
            steps,
            registers,
            switches,
            result,
            beside,
            signs,
            never_falls_with_v,
            falling: Default::default(),
        }
    }

    /// The same expression with a second one `beside` it, at `parameters` of its own: a series of the one comes with that
    /// of the other, and both have their sides among [`Bound::switches`].
    #[must_use]
    pub(crate) fn with(&self, beside: &Tape, parameters: &[S]) -> Self {
        Self::of(self.tape.clone(), &self.parameters, Some((beside, parameters)))
    }

    /// The register of the second expression; its value where it has none.
    pub(crate) fn beside(&self) -> Option<Result<usize, S>> {
        self.beside.map(|value| match value {
            Value::Register(register) => Ok(register),
            Value::Constant(constant) => Err(constant),
        })
    }

    /// Value at depth `x` (m) and velocity `v` (m/s); not finite where [`Bound::explain`] says why.
    ///
    /// At a kink the side on which the switch is not negative.
    #[inline]
    pub fn eval(&self, x: S, v: S) -> S {
        self.eval_in(x, v, |constant| constant)
    }

    #[inline]
    fn eval_in<T: Scalar>(&self, x: T, v: T, lift: impl Fn(S) -> T + Copy) -> T {
        match self.result {
            Value::Constant(constant) => lift(constant),
            Value::Register(result) => self.run(x, v, lift, |registers| registers[result]),
        }
    }

    /// What `then` takes from the values of all registers.
    #[inline]
    fn run<T: Scalar, A>(&self, x: T, v: T, lift: impl Fn(S) -> T + Copy, then: impl FnOnce(&[T]) -> A) -> A {
        if self.registers <= FEW {
            let mut registers = [T::zero(); FEW];
            self.fill(&mut registers, x, v, lift);
            then(&registers)
        } else if self.registers <= MANY {
            let mut registers = [T::zero(); MANY];
            self.fill(&mut registers, x, v, lift);
            then(&registers)
        } else {
            let mut registers = vec![T::zero(); self.registers];
            self.fill(&mut registers, x, v, lift);
            then(&registers)
        }
    }

    #[inline]
    fn fill<T: Scalar>(&self, registers: &mut [T], x: T, v: T, lift: impl Fn(S) -> T + Copy) {
        registers[..2].copy_from_slice(&[self.signed(0, x), self.signed(1, v)]);
        let mut place = 2;
        for step in &self.steps {
            let (first, second) = step.values::<_, false>(|register| registers[register], lift);
            registers[place] = self.signed(place, first);
            place += 1;
            if step.width() == 2 {
                registers[place] = self.signed(place, second);
                place += 1;
            }
        }
    }

    /// The values of all registers at N depths and velocities, side by side: a step of the tape serves all of them. Where V falls over
    /// a variable, at these places of it, its powers need no root.
    pub(crate) fn along<const N: usize>(
        &self,
        (x, v): ([S; N], [S; N]),
        fall: Option<(&Falling, &[S; N])>,
    ) -> Vec<[S; N]> {
        let mut registers = Vec::with_capacity(self.registers);
        registers.extend([x, v]);
        for step in &self.steps {
            let place = registers.len();
            // Rows are made where they stay: to copy one waits until it is written.
            registers.extend((0..step.width()).map(|_| [S::zero(); N]));
            let (done, rest) = registers.split_at_mut(place);
            let of = |register: usize| -> &[S; N] { &done[register] };
            let Some((first, rest)) = rest.split_first_mut() else { continue };
            // One loop for each kind of step, which the compiler turns into vector instructions.
            match *step {
                Step::Affine { a, factor, shift } => set(first, |lane| of(a)[lane] * factor + shift),
                Step::Sum { a, b, factor } => set(first, |lane| of(a)[lane] + of(b)[lane] * factor),
                Step::Share { a, divisor, .. } => set(first, |lane| of(a)[lane].over(divisor)),
                Step::Multiply { a, b } => set(first, |lane| of(a)[lane] * of(b)[lane]),
                Step::Square { a } => set(first, |lane| of(a)[lane] * of(a)[lane]),
                Step::Select { switch, above, below, .. } => {
                    set(first, |lane| of(switch)[lane].select(of(above)[lane], of(below)[lane]));
                }
                Step::Divide { a, b } => set(first, |lane| of(a)[lane].over(of(b)[lane])),
                Step::Ratio { dividend, b } => set(first, |lane| dividend.over(of(b)[lane])),
                Step::Sqrt { a } => set(first, |lane| of(a)[lane].sqrt()),
                Step::HalfPower { a, whole, root, exponent } => set(first, |lane| {
                    let slope = || exponent * of(a)[lane].value().powf(exponent - 1.0);
                    of(a)[lane].with_slope(of(whole)[lane] * of(root)[lane], slope)
                }),
                Step::Tanh { a, .. } => {
                    set(first, |lane| tanh(of(a)[lane]));
                    if let Some(second) = rest.first_mut() {
                        set(second, |lane| S::one() - first[lane] * first[lane]);
                    }
                }
                _ => {
                    let values = |lane: usize| step.values::<_, false>(|register| of(register)[lane], |value| value);
                    let is_filled =
                        fall.is_some_and(|(falling, s)| falling.fill_along(step, place, s, || values(0).0, first));
                    if is_filled {
                        continue;
                    }
                    match rest.first_mut() {
                        Some(second) => set(first, |lane| {
                            let (value, behind) = values(lane);
                            second[lane] = behind;
                            value
                        }),
                        None => set(first, |lane| values(lane).0),
                    }
                }
            }
        }
        registers
    }

    /// The values of the expression among those of its registers.
    pub(crate) fn result_of<const N: usize>(&self, registers: &[[S; N]]) -> [S; N] {
        self.result.among(registers)
    }

    /// The values of the second expression, where there is one, else of the first.
    pub(crate) fn beside_of<const N: usize>(&self, registers: &[[S; N]]) -> [S; N] {
        self.beside.unwrap_or(self.result).among(registers)
    }

    /// `p(x) + q(x) V²` as p, and q as the second expression; `None` where it is built in another way.
    pub(crate) fn by_square_of_v(&self) -> Option<Self> {
        let (p, q) = self.tape.by_square_of_v()?;
        Some(Self::of(p.clone(), &self.parameters, Some((q, &self.parameters))))
    }

    /// `value` of a register, without what rounding put below zero.
    #[inline(always)]
    pub(super) fn signed<T: Scalar>(&self, register: usize, value: T) -> T {
        if T::HAS_RANGE && self.signs[register] { value.not_negative() } else { value }
    }

    /// Whether the value is known not to fall with V, at any depth x >= 0 and V >= 0.
    pub(crate) fn never_falls_with_v(&self) -> bool {
        self.never_falls_with_v
    }

    /// The expression that was bound.
    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    /// Registers whose sign decides between the branches of `abs`, `min` and `max`: of `a` in `abs(a)`, of `a - b` in the
    /// others. Not those that x and V do not change.
    ///
    /// The series of a switch may end early where that of the expression does not: in `max(P, Q*sqrt(x))` at x = 0 the term that
    /// is not chosen has none.
    pub fn switches(&self) -> &[usize] {
        &self.switches
    }

    /// The side of each of [`Bound::switches`] at (`x`, `v`): whether its register is not negative.
    pub fn sides(&self, x: S, v: S) -> SmallVec<[bool; 4]> {
        self.switch_values(x, v).iter().map(|value| value.value() >= 0.0).collect()
    }

    /// The values of [`Bound::switches`] at (`x`, `v`).
    pub(crate) fn switch_values(&self, x: S, v: S) -> SmallVec<[S; 4]> {
        if self.switches.is_empty() {
            return SmallVec::new();
        }
        let values = |registers: &[S]| self.switches.iter().map(|switch| registers[*switch]).collect();
        self.run(x, v, |constant| constant, values)
    }

    /// The first term that has no value at depth `x` (m) and velocity `v` (m/s), and why; `None` if each has one.
    pub fn explain(&self, x: f64, v: f64) -> Option<DomainError> {
        self.tape.fault(&self.parameters, x, v, false)
    }

    /// As [`Bound::explain`], also of a term that has a value and no power series there: a root of zero.
    pub fn explain_series(&self, x: f64, v: f64) -> Option<DomainError> {
        self.tape.fault(&self.parameters, x, v, true)
    }

    /// What the expression is at rest, on `sides` of its switches: smooth, or with a branch point at V = 0.
    ///
    /// Of `(V/v1)^1.5`, `V*sqrt(V)` and `sqrt(x*V^3)` it is smooth in u, `V = u²`; of `(V/v1)^0.23` and `log(V/v1)` in the
    /// logarithm of V alone. `(V - v1)^1.5` has no branch point there.
    ///
    /// # Panics
    /// If there is not a side for each of [`Bound::switches`].
    pub fn falling(&self, sides: &[bool]) -> Arc<Falling> {
        let find = || Arc::new(self.falling_on(sides));
        if self.switches.len() > SWITCHES_KEPT {
            return find();
        }
        let place = sides.iter().fold(0, |place, side| 2 * place + usize::from(*side));
        Arc::clone(self.falling[place].get_or_init(find))
    }

    fn falling_on(&self, sides: &[bool]) -> Falling {
        let degrees = degrees(&self.steps, self.registers, sides);
        let mut is_used: SmallVec<[bool; FEW]> = SmallVec::from_elem(false, self.registers);
        for value in [Some(self.result), self.beside].into_iter().flatten() {
            if let Value::Register(register) = value {
                is_used[register] = true;
            }
        }
        let (mut place, mut powers, mut has_logarithm) = (self.registers, SmallVec::<[f64; 4]>::new(), false);
        for step in self.steps.iter().rev() {
            place -= step.width();
            if !is_used[place..place + step.width()].contains(&true) {
                continue;
            }
            step.operands(sides, |operand| is_used[operand] = true);
            match *step {
                Step::Integral { function: Function::Log | Function::Log10, a, .. } => {
                    has_logarithm |= degrees[a].of_v.abs() > 0.0;
                }
                Step::Sqrt { .. } | Step::HalfPower { .. } | Step::Power { .. } => {
                    powers.extend(Some(degrees[place].of_v).filter(|power| !power.is_nan()));
                }
                _ => {}
            }
        }
        let is_whole = |m: u32| powers.iter().all(|power| (power * f64::from(m)).fract() == 0.0);
        let root = (1..=ROOT_MAX).find(|m| !has_logarithm && is_whole(*m));
        let plain = degrees.iter().map(|degree| if degree.is_plain { degree.of_v } else { f64::NAN });
        Falling { fall: root.map_or(Fall::Exponential, Fall::Power), powers: plain.collect() }
    }

    pub(super) fn steps(&self) -> &[Step<S>] {
        &self.steps
    }

    pub(super) fn registers(&self) -> usize {
        self.registers
    }

    pub(super) fn result(&self) -> Value<S> {
        self.result
    }
}

impl Bound {
    /// The expressions of N problems side by side; `None` where they do not take the same steps.
    pub(crate) fn in_lanes<const N: usize>(bounds: [&Self; N]) -> Option<Bound<Lanes<N>>> {
        let first = *bounds.first()?;
        let step = |index: usize| {
            let mut numbers = [Lanes([0.0; N]); NUMBERS_MAX];
            let mut shape = None;
            for (lane, bound) in bounds.iter().enumerate() {
                let mut next = numbers.iter_mut();
                let number = |number| next.next().map_or((), |lanes| lanes.0[lane] = number);
                let own = bound.steps.get(index)?.map(number);
                if *shape.get_or_insert(own) != own {
                    return None;
                }
            }
            let mut numbers = numbers.into_iter();
            let step = shape?.map(|()| numbers.next().unwrap_or(Lanes([0.0; N])));
            // What a power has for a series depends on its exponent.
            let is_one_power =
                !matches!(step, Step::Power { exponent, .. } if exponent.0.iter().any(|one| *one != exponent.0[0]));
            is_one_power.then_some(step)
        };
        let steps: Vec<_> = (0..first.steps.len()).map_while(step).collect();
        let (Value::Register(result), true) = (first.result, steps.len() == first.steps.len()) else { return None };
        let is_same = |bound: &&Self| bound.steps.len() == steps.len() && bound.result == first.result;
        bounds.iter().all(is_same).then(|| Bound {
            tape: first.tape.clone(),
            parameters: SmallVec::new(),
            steps,
            registers: first.registers,
            switches: first.switches.clone(),
            result: Value::Register(result),
            beside: None,
            signs: first.signs.clone(),
            never_falls_with_v: first.never_falls_with_v,
            falling: Default::default(),
        })
    }

    /// The values of the two sides of an equation; of any other expression, its value and zero.
    pub(crate) fn sides_of_equation(&self, x: f64, v: f64) -> (f64, f64) {
        let values = self.tape.values(&self.parameters, x, v);
        match self.tape.terms().last() {
            Some(Term::Binary(Binary::Subtract, a, b)) => (values[a], values[b]),
            _ => (values.last().copied().unwrap_or(0.0), 0.0),
        }
    }

    /// F, dF/dx and dF/dV at depth `x` (m) and velocity `v` (m/s), the derivatives exact as far as f64 rounds.
    pub fn gradient(&self, x: f64, v: f64) -> (f64, f64, f64) {
        // Dual numbers divide with another rounding.
        (self.eval(x, v), self.slope((x, 1.0), (v, 0.0)), self.slope((x, 0.0), (v, 1.0)))
    }

    /// A switch, by its place among [`Bound::switches`], and its derivative by V.
    pub(crate) fn switch_over_velocity(&self, switch: usize, x: f64, v: f64) -> (f64, f64) {
        let value =
            self.run(Dual64::from_f64(x), Dual64::new(v, 1.0), Dual64::from_f64, |all| all[self.switches[switch]]);
        (value.re, value.eps)
    }

    /// The derivative at depth `x` (m) and velocity `v` (m/s), each with how it changes.
    #[inline]
    pub(crate) fn slope(&self, x: (f64, f64), v: (f64, f64)) -> f64 {
        self.eval_in(Dual64::new(x.0, x.1), Dual64::new(v.0, v.1), Dual64::from_f64).eps
    }
}

/// What several terms share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shared {
    Sqrt(usize),
    Slope(usize),
    SinCos(usize),
    Product(usize, usize),
    Difference(usize, usize),
}

/// Steps in the making.
#[derive(Debug)]
struct Making<S> {
    steps: Vec<Step<S>>,
    registers: usize,
    switches: SmallVec<[usize; 4]>,
    shared: Vec<(Shared, usize)>,
}

impl<S> Default for Making<S> {
    fn default() -> Self {
        // The first two registers are x and V.
        Self { steps: Vec::new(), registers: 2, switches: SmallVec::new(), shared: Vec::new() }
    }
}

impl<S: Scalar> Making<S> {
    /// The value of `tape` at `parameters`.
    fn value(&mut self, tape: &Tape, parameters: &[S]) -> Value<S> {
        let mut values: Vec<Value<S>> = Vec::with_capacity(tape.terms().len());
        let mut uses = vec![0; tape.terms().len()];
        for term in tape.terms() {
            term.operands().for_each(|operand| uses[operand] += 1);
        }
        for term in tape.terms() {
            let value = match term {
                Term::Number(bits) => Value::Constant(tape.number(bits)),
                Term::Parameter(index) => Value::Constant(parameters[index]),
                Term::X => Value::Register(0),
                Term::V => Value::Register(1),
                Term::Negative(of) => self.negative(values[of]),
                Term::Call(function, of) => match values[of] {
                    Value::Constant(of) => Value::Constant(tape::call(function, of)),
                    Value::Register(a) => Value::Register(self.call(function, a)),
                },
                Term::Binary(operation, a, b) => self.operation(operation, [values[a], values[b]], [uses[a], uses[b]]),
            };
            values.push(value);
        }
        values.last().copied().unwrap_or(Value::Constant(S::zero()))
    }

    fn push(&mut self, step: Step<S>) -> usize {
        let register = self.registers;
        self.registers += step.width();
        self.steps.push(step);
        register
    }

    fn share(&mut self, what: Shared, step: Step<S>) -> usize {
        if let Some((_, register)) = self.shared.iter().find(|(known, _)| *known == what) {
            return *register;
        }
        let register = self.push(step);
        self.shared.push((what, register));
        register
    }

    fn product(&mut self, a: usize, b: usize) -> usize {
        let step = if a == b { Step::Square { a } } else { Step::Multiply { a, b } };
        self.share(Shared::Product(a.min(b), a.max(b)), step)
    }

    fn slope(&mut self, a: usize) -> usize {
        self.share(Shared::Slope(a), Step::Slope { a })
    }

    /// `factor a + shift`.
    fn affine(&mut self, a: usize, factor: S, shift: S) -> usize {
        self.push(Step::Affine { a, factor, shift })
    }

    /// The register of `value`.
    fn register(&mut self, value: Value<S>) -> usize {
        match value {
            Value::Constant(value) => self.push(Step::Constant { value }),
            Value::Register(register) => register,
        }
    }

    fn negative(&mut self, of: Value<S>) -> Value<S> {
        match of {
            Value::Constant(of) => Value::Constant(-of),
            Value::Register(a) => Value::Register(self.affine(a, S::from_f64(-1.0), S::zero())),
        }
    }

    /// Of two values, and how often each is used.
    fn operation(&mut self, operation: Binary, [first, second]: [Value<S>; 2], uses: [usize; 2]) -> Value<S> {
        let joined = match (operation, first, second) {
            (_, Value::Constant(a), Value::Constant(b)) => Some(Value::Constant(tape::binary(operation, a, b))),
            (Binary::Add, ..) => self.joined(first, second, S::one(), uses[0], uses[1]),
            (Binary::Subtract, ..) => self.joined(first, second, S::from_f64(-1.0), uses[0], uses[1]),
            _ => None,
        };
        joined.unwrap_or_else(|| self.binary(operation, first, second))
    }

    fn call(&mut self, function: Function, a: usize) -> usize {
        match function {
            Function::Sqrt => self.share(Shared::Sqrt(a), Step::Sqrt { a }),
            Function::Abs => {
                let below = self.affine(a, S::from_f64(-1.0), S::zero());
                self.select(a, (a, below), true)
            }
            Function::Exp => {
                let slope = self.slope(a);
                self.push(Step::Exp { a, slope })
            }
            Function::Tanh => {
                let slope = self.slope(a);
                self.push(Step::Tanh { a, slope })
            }
            Function::Sin | Function::Cos => {
                let slope = self.slope(a);
                let sine = self.share(Shared::SinCos(a), Step::SinCos { a, slope });
                if function == Function::Sin { sine } else { sine + 1 }
            }
            Function::Log | Function::Log10 | Function::Atan => {
                let slope = self.slope(a);
                let divisor = if function == Function::Atan {
                    let square = self.product(a, a);
                    self.affine(square, S::one(), S::one())
                } else {
                    a
                };
                let one = S::one();
                let factor = if function == Function::Log10 { one.over(S::from_f64(10.0).ln()) } else { one };
                let less_one = if function == Function::Log { self.less_one(a) } else { None };
                self.push(Step::Integral { function, a, less_one, slope, divisor, factor })
            }
        }
    }

    /// The register of u where `a` was made as `1 + u`.
    fn less_one(&mut self, a: usize) -> Option<usize> {
        let mut place = 2;
        let step = self.steps.iter().find(|step| {
            place += step.width();
            place > a
        })?;
        let &Step::Affine { a: of, factor, shift } = step else { return None };
        if !(shift.value() == 1.0 && shift.is_constant()) {
            return None;
        }
        let is_itself = factor.value() == 1.0 && factor.is_constant();
        Some(if is_itself { of } else { self.affine(of, factor, S::zero()) })
    }

    fn binary(&mut self, operation: Binary, first: Value<S>, second: Value<S>) -> Value<S> {
        use Value::{Constant, Register};
        Register(match (operation, first, second) {
            (_, Constant(a), Constant(b)) => return Constant(tape::binary(operation, a, b)),
            (Binary::Add, Register(a), Constant(shift)) | (Binary::Add, Constant(shift), Register(a)) => {
                self.affine(a, S::one(), shift)
            }
            (Binary::Add, Register(a), Register(b)) => self.push(Step::Sum { a, b, factor: S::one() }),
            (Binary::Subtract, ..) => return self.difference(first, second),
            (Binary::Multiply, Register(a), Constant(factor)) | (Binary::Multiply, Constant(factor), Register(a)) => {
                self.affine(a, factor, S::zero())
            }
            (Binary::Multiply, Register(a), Register(b)) => self.product(a, b),
            (Binary::Divide, Register(a), Constant(divisor)) => {
                self.push(Step::Share { a, divisor, inverse: S::one().over(divisor) })
            }
            (Binary::Divide, Constant(dividend), Register(b)) => self.push(Step::Ratio { dividend, b }),
            (Binary::Divide, Register(a), Register(b)) => self.push(Step::Divide { a, b }),
            (Binary::Power, Register(a), Constant(exponent)) => return self.power(a, exponent),
            (Binary::Power, base, Register(exponent)) => {
                // The units were checked, and with them that no exponent varies; a^b is exp(b log a) all the same.
                let logarithm = match base {
                    Constant(base) => Constant(base.ln()),
                    Register(base) => Register(self.call(Function::Log, base)),
                };
                match self.binary(Binary::Multiply, logarithm, Register(exponent)) {
                    Register(product) => self.call(Function::Exp, product),
                    Constant(product) => return Constant(product.exp()),
                }
            }
            (Binary::Min, ..) => return self.extreme(first, second, false),
            (Binary::Max, ..) => return self.extreme(first, second, true),
        })
    }

    /// `first + sign second` in one step with the product by a constant that one of them is, if it is the last step and
    /// nothing else uses it.
    fn joined(
        &mut self,
        first: Value<S>,
        second: Value<S>,
        sign: S,
        uses_first: usize,
        uses_second: usize,
    ) -> Option<Value<S>> {
        use Value::{Constant, Register};
        let Some(&Step::Affine { a, factor, shift }) = self.steps.last() else { return None };
        let last = self.registers - 1;
        let is_last = |value, uses| matches!(value, Register(register) if register == last && uses == 1);
        if shift.value() != 0.0 || !shift.is_constant() {
            return None;
        }
        let step = match (first, second) {
            (_, Constant(shift)) if is_last(first, uses_first) => Step::Affine { a, factor, shift: sign * shift },
            (Constant(shift), _) if is_last(second, uses_second) => Step::Affine { a, factor: sign * factor, shift },
            (Register(first), _) if is_last(second, uses_second) => Step::Sum { a: first, b: a, factor: sign * factor },
            _ => return None,
        };
        self.steps.pop();
        self.registers -= 1;
        Some(Register(self.push(step)))
    }

    fn difference(&mut self, first: Value<S>, second: Value<S>) -> Value<S> {
        use Value::{Constant, Register};
        let minus = S::from_f64(-1.0);
        match (first, second) {
            (Constant(a), Constant(b)) => Constant(a - b),
            (Register(a), Constant(b)) => Register(self.affine(a, S::one(), -b)),
            (Constant(shift), Register(a)) => Register(self.affine(a, minus, shift)),
            (Register(a), Register(b)) => {
                Register(self.share(Shared::Difference(a, b), Step::Sum { a, b, factor: minus }))
            }
        }
    }

    /// The greater or the lesser of two, of which one is no constant.
    fn extreme(&mut self, first: Value<S>, second: Value<S>, greater: bool) -> Value<S> {
        let (above, below) = if greater { (first, second) } else { (second, first) };
        match self.difference(first, second) {
            Value::Register(switch) => {
                let (above, below) = (self.register(above), self.register(below));
                Value::Register(self.select(switch, (above, below), greater))
            }
            Value::Constant(switch) => {
                if switch.value() >= 0.0 {
                    above
                } else {
                    below
                }
            }
        }
    }

    fn select(&mut self, switch: usize, (above, below): (usize, usize), greater: bool) -> usize {
        let known = self.switches.iter().position(|known| *known == switch);
        let index = known.unwrap_or_else(|| {
            self.switches.push(switch);
            self.switches.len() - 1
        });
        self.push(Step::Select { index, switch, above, below, greater })
    }

    fn power(&mut self, a: usize, exponent: S) -> Value<S> {
        let size = exponent.value().abs();
        let power = if !exponent.is_constant() {
            None
        } else if size == 0.0 {
            return Value::Constant(S::one());
        } else if size.fract() == 0.0 && size <= POWER_MAX {
            Some(self.whole_power(a, size as u32))
        } else if size.fract() == 0.5 && size <= HALF_POWER_MAX {
            Some(self.half_power(a, size))
        } else {
            None
        };
        Value::Register(match power {
            Some(power) if exponent.value() < 0.0 => self.push(Step::Ratio { dividend: S::one(), b: power }),
            Some(power) => power,
            None => {
                let slope = self.slope(a);
                self.push(Step::Power { a, slope, exponent })
            }
        })
    }

    fn whole_power(&mut self, a: usize, exponent: u32) -> usize {
        if exponent == 1 {
            a
        } else if exponent % 2 == 1 {
            let rest = self.whole_power(a, exponent - 1);
            self.product(a, rest)
        } else {
            let half = self.whole_power(a, exponent / 2);
            self.product(half, half)
        }
    }

    fn half_power(&mut self, a: usize, exponent: f64) -> usize {
        let root = self.share(Shared::Sqrt(a), Step::Sqrt { a });
        if exponent == 0.5 {
            return root;
        }
        let whole = self.whole_power(a, exponent as u32);
        self.push(Step::HalfPower { a, whole, root, exponent })
    }
}
