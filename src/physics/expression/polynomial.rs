//! Is an expression built as `p + s x + r V + q V²`, and with which coefficients?

use super::parse::{Binary, Term};
use super::tape::{self, Tape};
use crate::physics::scalar::Scalar;

/// Coefficients of 1, x, V and V²; `None` for a term that is not there.
#[derive(Clone, Copy)]
struct Polynomial<S>([Option<S>; 4]);

impl<S: Scalar> Polynomial<S> {
    fn constant(value: S) -> Self {
        Self([Some(value), None, None, None])
    }

    /// Its value, if neither x nor V is in it.
    fn value(self) -> Option<S> {
        match self.0 {
            [value, None, None, None] => value,
            _ => None,
        }
    }

    fn map(self, of: impl Fn(S) -> S) -> Self {
        Self(self.0.map(|term| term.map(&of)))
    }

    fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| sum(self.0[i], other.0[i])))
    }

    /// The product, if it has no other terms.
    fn times(self, other: Self) -> Option<Self> {
        if let Some(factor) = self.value() {
            return Some(other.map(|term| factor * term));
        }
        if let Some(factor) = other.value() {
            return Some(self.map(|term| term * factor));
        }
        let ([a, None, b, None], [c, None, d, None]) = (self.0, other.0) else { return None };
        let product = |one: Option<S>, other: Option<S>| Some(one? * other?);
        Some(Self([product(a, c), None, sum(product(a, d), product(b, c)), product(b, d)]))
    }
}

fn sum<S: Scalar>(one: Option<S>, other: Option<S>) -> Option<S> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one + other),
        (one, other) => one.or(other),
    }
}

impl Tape {
    /// p, s, r and q (SI units) with these parameters of an expression that is built as `p + s x + r V + q V²` by sums, products,
    /// squares and quotients, whatever its parameters are made of; `None` for any other.
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::expression::{Known, Tape};
    /// use penetrode::physics::units::Dimension;
    ///
    /// let known = [
    ///     Known { name: "P", value: 800.0, unit: Dimension::Force.into() },
    ///     Known { name: "v1", value: 16.0, unit: Dimension::Velocity.into() },
    /// ];
    /// let of = |text| Tape::read(text, &known, Dimension::Force.into()).map(|tape| tape.coefficients(tape.parameters()));
    /// assert_eq!(of("P*(1 + V/v1)^2"), Ok(Some([800.0, 0.0, 100.0, 3.125])));
    /// assert_eq!(of("P*(V/v1)^1.5"), Ok(None));
    /// ```
    pub fn coefficients<S: Scalar>(&self, parameters: &[S]) -> Option<[S; 4]> {
        let mut terms: Vec<Polynomial<S>> = Vec::with_capacity(self.terms().len());
        for term in self.terms() {
            let next = match term {
                Term::Number(bits) => Polynomial::constant(self.number(bits)),
                Term::Parameter(index) => Polynomial::constant(*parameters.get(index)?),
                Term::X => Polynomial([None, Some(S::one()), None, None]),
                Term::V => Polynomial([None, None, Some(S::one()), None]),
                Term::Negative(of) => terms[of].map(|term| -term),
                Term::Binary(Binary::Add, a, b) => terms[a].plus(terms[b]),
                Term::Binary(Binary::Subtract, a, b) => terms[a].plus(terms[b].map(|term| -term)),
                Term::Binary(Binary::Multiply, a, b) => terms[a].times(terms[b])?,
                Term::Binary(Binary::Divide, a, b) if terms[a].value().is_none() => {
                    let divisor = terms[b].value()?;
                    terms[a].map(|term| term.over(divisor))
                }
                Term::Binary(Binary::Power, a, b) if terms[a].value().is_none() => {
                    let exponent = terms[b].value().filter(|exponent| exponent.is_constant())?;
                    match exponent.value() {
                        1.0 => terms[a],
                        2.0 => terms[a].times(terms[a])?,
                        _ => return None,
                    }
                }
                Term::Binary(operation, a, b) => {
                    Polynomial::constant(tape::binary(operation, terms[a].value()?, terms[b].value()?))
                }
                Term::Call(function, of) => Polynomial::constant(tape::call(function, terms[of].value()?)),
            };
            terms.push(next);
        }
        let Polynomial(whole) = *terms.last()?;
        Some(whole.map(|term| term.unwrap_or(S::zero())))
    }
}
