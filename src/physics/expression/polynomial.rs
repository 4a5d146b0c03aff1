//! Is an expression built as `p + s x + r V + q V²`, and with which coefficients? Or as `p(x) + q(x) V²`, and of which parts?

use std::ops::Range;

use super::parse::{Binary, Node, Term};
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

/// The parts of a term that stand with 1, V and V², by their places among the nodes made; `None` for one that is not there.
type Parts = [Option<usize>; 3];

/// Nodes in the making, for a term at `span` of the text.
struct Making {
    nodes: Vec<Node>,
    span: Range<usize>,
}

impl Making {
    fn push(&mut self, term: Term) -> usize {
        self.nodes.push(Node { term, span: self.span.clone() });
        self.nodes.len() - 1
    }

    fn is_one(&self, part: usize) -> bool {
        self.nodes[part].term == Term::number(1.0)
    }

    fn product(&mut self, a: usize, b: usize) -> usize {
        match (self.is_one(a), self.is_one(b)) {
            (true, _) => b,
            (_, true) => a,
            _ => self.push(Term::Binary(Binary::Multiply, a, b)),
        }
    }

    fn map(&mut self, parts: Parts, with: impl Fn(usize) -> Term) -> Parts {
        parts.map(|part| part.map(|part| self.push(with(part))))
    }

    fn sum(&mut self, operation: Binary, [one, other]: [Option<usize>; 2]) -> Option<usize> {
        match (one, other) {
            (Some(one), Some(other)) => Some(self.push(Term::Binary(operation, one, other))),
            (None, Some(other)) if operation == Binary::Subtract => Some(self.push(Term::Negative(other))),
            (one, other) => one.or(other),
        }
    }

    /// The product, if V has no higher power in it.
    fn times(&mut self, one: Parts, other: Parts) -> Option<Parts> {
        let mut parts = [None; 3];
        for (i, a) in one.into_iter().enumerate() {
            for (j, b) in other.into_iter().enumerate() {
                let (Some(a), Some(b)) = (a, b) else { continue };
                let product = self.product(a, b);
                let part = *parts.get(i + j)?;
                parts[i + j] = self.sum(Binary::Add, [part, Some(product)]);
            }
        }
        Some(parts)
    }

    /// The parts of a term, made of those of the `terms` before it; `None` where it is built in another way.
    fn parts(&mut self, term: Term, terms: &[Parts]) -> Option<Parts> {
        // Without V.
        let free = |of: usize| if let [of, None, None] = terms[of] { of } else { None };
        Some(match term {
            Term::V => [None, Some(self.push(Term::number(1.0))), None],
            Term::Number(_) | Term::Parameter(_) | Term::X => [Some(self.push(term)), None, None],
            Term::Negative(of) => self.map(terms[of], Term::Negative),
            Term::Binary(operation @ (Binary::Add | Binary::Subtract), a, b) => {
                let (one, other) = (terms[a], terms[b]);
                std::array::from_fn(|i| self.sum(operation, [one[i], other[i]]))
            }
            Term::Binary(Binary::Multiply, a, b) => self.times(terms[a], terms[b])?,
            Term::Binary(Binary::Divide, a, b) => {
                let divisor = free(b)?;
                self.map(terms[a], |part| Term::Binary(Binary::Divide, part, divisor))
            }
            Term::Binary(Binary::Power, a, b) if free(a).is_none() => match self.nodes[free(b)?].term {
                exponent if exponent == Term::number(1.0) => terms[a],
                exponent if exponent == Term::number(2.0) => self.times(terms[a], terms[a])?,
                _ => return None,
            },
            Term::Binary(operation, a, b) => {
                let term = Term::Binary(operation, free(a)?, free(b)?);
                [Some(self.push(term)), None, None]
            }
            Term::Call(function, of) => {
                let term = Term::Call(function, free(of)?);
                [Some(self.push(term)), None, None]
            }
        })
    }

    /// The nodes that the one at `last` is made of, and it.
    fn up_to(&self, last: usize) -> Vec<Node> {
        let mut is_used = vec![false; last + 1];
        is_used[last] = true;
        for place in (0..=last).rev() {
            if is_used[place] {
                self.nodes[place].term.operands().for_each(|operand| is_used[operand] = true);
            }
        }
        let mut places = vec![0; last + 1];
        let mut kept: Vec<Node> = Vec::new();
        for (place, node) in self.nodes.iter().take(last + 1).enumerate().filter(|(place, _)| is_used[*place]) {
            places[place] = kept.len();
            kept.push(Node { term: node.term.moved(|operand| places[operand]), span: node.span.clone() });
        }
        kept
    }
}

/// p and q, each as terms of x alone, of an expression that is built as `p(x) + q(x) V²`; `None` for any other.
pub(super) fn by_square_of_v(terms: &[Node]) -> Option<[Vec<Node>; 2]> {
    let mut making = Making { nodes: Vec::new(), span: 0..0 };
    let mut parts: Vec<Parts> = Vec::with_capacity(terms.len());
    for Node { term, span } in terms {
        making.span.clone_from(span);
        let next = making.parts(*term, &parts)?;
        parts.push(next);
    }
    let [Some(p), None, q] = *parts.last()? else { return None };
    let q = q.unwrap_or_else(|| making.push(Term::number(0.0)));
    Some([making.up_to(p), making.up_to(q)])
}
