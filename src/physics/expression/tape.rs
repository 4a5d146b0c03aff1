//! One list of operations for every number type: each term once, operands before what is made of them.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use thiserror::Error;

use super::bound::Bound;
use super::parse::{self, Binary, Function, Node, Term};
use super::unit::{self, Unit};
use super::{ExpressionError, Known, polynomial, quoted};
use crate::physics::scalar::Scalar;
use crate::text::Shown;

/// An expression that was read, its units checked: a function of depth x, velocity V and the parameters it was read with.
///
/// Equal terms are one. A copy shares the list.
#[derive(Clone, Debug, PartialEq)]
pub struct Tape(Arc<Program>);

#[derive(Debug)]
struct Program {
    text: String,
    /// Each with the place of its first occurrence; the whole is the last.
    nodes: Vec<Node>,
    /// Per node, whether x or V is in it.
    varies: Vec<bool>,
    /// Values of all known quantities, used or not.
    parameters: Vec<f64>,
    /// The bits of numbers of which the text has more than 15 digits.
    long_numbers: Vec<u64>,
    /// [`Tape::by_square_of_v`], once it was asked for.
    parts: OnceLock<Option<(Tape, Tape)>>,
}

/// The same function of x, V and its parameters, whatever the values that it was read with.
impl PartialEq for Program {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other) || self.text == other.text && self.nodes == other.nodes
    }
}

impl Tape {
    /// Reads `text`, which uses quantities `known` by name and has the unit `wanted`.
    ///
    /// # Errors
    /// [`ExpressionError`]: no expression, an unknown name, a unit that does not fit, longer than [`super::LENGTH_MAX`]
    /// or deeper than [`super::NESTING_MAX`].
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::expression::{Known, Tape};
    /// use penetrode::physics::units::Dimension;
    ///
    /// let known = [
    ///     Known { name: "P", value: 848e3, unit: Dimension::Force.into() },
    ///     Known { name: "Q", value: 3.25, unit: Dimension::Drag.into() },
    /// ];
    /// let force = Tape::read("P + Q*V^2", &known, Dimension::Force.into())?;
    /// assert_eq!(force.bind(force.parameters()).eval(0.1, 200.0), 978e3);
    /// assert_eq!(force.bind(&[1e6, 2.5]).gradient(0.1, 200.0), (1.1e6, 0.0, 1e3));
    ///
    /// let error = Tape::read("P + Q*V", &known, Dimension::Force.into()).unwrap_err();
    /// assert_eq!(error.message, "`Q*V` is kg/s, here a force (N) is added");
    /// # Ok::<(), penetrode::physics::expression::ExpressionError>(())
    /// ```
    pub fn read(text: &str, known: &[Known<'_>], wanted: Unit) -> Result<Self, ExpressionError> {
        let nodes = parse::parse(text, known)?;
        unit::check(text, &nodes, known, Some(wanted))?;
        Ok(Self::of(text, nodes, known))
    }

    /// Reads the equation `text`, two expressions of one unit with `=` between them, as its left side less its right.
    ///
    /// # Errors
    /// As [`Tape::read`]; also a text without `=`, or with more than one.
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::expression::{Known, Tape};
    /// use penetrode::physics::units::Dimension;
    ///
    /// let known = [Known { name: "v1", value: 61.0, unit: Dimension::Velocity.into() }];
    /// let end = Tape::read_equation("V = v1", &known)?;
    /// assert_eq!(end.bind(end.parameters()).eval(0.1, 200.0), 139.0);
    ///
    /// let error = Tape::read_equation("x = v1", &known).unwrap_err();
    /// assert_eq!(error.message, "`v1` is m/s, here a length (m) is compared");
    /// # Ok::<(), penetrode::physics::expression::ExpressionError>(())
    /// ```
    pub fn read_equation(text: &str, known: &[Known<'_>]) -> Result<Self, ExpressionError> {
        let sides: Vec<&str> = text.split('=').collect();
        let [left, right] = sides[..] else {
            let message =
                if sides.len() < 2 { "the equation has no `=`" } else { "the equation has more than one `=`" };
            let span = text.match_indices('=').nth(1).map_or(0..text.len(), |(start, _)| start..start + 1);
            let help = "write for instance \"V = v1\", with v1 in [parameters]";
            return Err(ExpressionError::new(span, message, "one expression, `=`, and another", help));
        };
        let mut nodes = parse::parse(left, known)?;
        let (count, start) = (nodes.len(), left.len() + 1);
        let behind = |mut error: ExpressionError| {
            error.span = error.span.start + start..error.span.end + start;
            error
        };
        let others = parse::parse(right, known).map_err(behind)?;
        nodes.extend(others.into_iter().map(|Node { term, span }| Node {
            term: term.moved(|operand| operand + count),
            span: span.start + start..span.end + start,
        }));
        let term = Term::Binary(Binary::Subtract, count - 1, nodes.len() - 1);
        nodes.push(Node { term, span: 0..text.len() });
        unit::check(text, &nodes, known, None)?;
        Ok(Self::of(text, nodes, known))
    }

    fn of(text: &str, nodes: Vec<Node>, known: &[Known<'_>]) -> Self {
        let parameters = known.iter().map(|known| known.value).collect();
        Self(Arc::new(Program::new(text.to_owned(), nodes, parameters)))
    }

    /// The text as it was read.
    pub fn text(&self) -> &str {
        &self.0.text
    }

    /// The text with the same spaces everywhere, as in `P + Q*V^2`.
    pub fn to_text(&self) -> String {
        parse::normalized(&self.0.text)
    }

    /// Values of the known quantities, in their order.
    pub fn parameters(&self) -> &[f64] {
        &self.0.parameters
    }

    /// What the number with these `bits` means in its text.
    pub(super) fn number<S: Scalar>(&self, bits: u64) -> S {
        S::literal(f64::from_bits(bits), !self.0.long_numbers.contains(&bits))
    }

    /// Whether it uses the known quantity of this index.
    pub fn uses(&self, parameter: usize) -> bool {
        self.contains(Term::Parameter(parameter))
    }

    /// Whether its value depends on x.
    pub fn depends_on_x(&self) -> bool {
        self.contains(Term::X)
    }

    /// Whether its value depends on V.
    pub fn depends_on_v(&self) -> bool {
        self.contains(Term::V)
    }

    fn contains(&self, term: Term) -> bool {
        self.0.nodes.iter().any(|node| node.term == term)
    }

    /// The expression with values of all known quantities, in their order: constants are computed once, in `S`.
    ///
    /// # Panics
    /// If there are fewer `parameters` than quantities were known.
    pub fn bind<S: Scalar>(&self, parameters: &[S]) -> Bound<S> {
        assert!(parameters.len() >= self.0.parameters.len(), "{} parameters are missing", self.0.parameters.len());
        Bound::new(self.clone(), parameters)
    }

    /// p and q of an expression that is built as `p(x) + q(x) V²`.
    pub(super) fn by_square_of_v(&self) -> Option<&(Self, Self)> {
        let part = |nodes| Self(Arc::new(Program::new(self.0.text.clone(), nodes, self.0.parameters.clone())));
        let parts = || polynomial::by_square_of_v(&self.0.nodes).map(|[p, q]| (part(p), part(q)));
        self.0.parts.get_or_init(parts).as_ref()
    }

    /// Its terms, the whole last.
    pub(super) fn terms(&self) -> impl ExactSizeIterator<Item = Term> {
        self.0.nodes.iter().map(|node| node.term)
    }

    /// Values of all terms with these parameters.
    pub(super) fn values<S: Scalar>(&self, parameters: &[S], x: S, v: S) -> Vec<S> {
        let mut values: Vec<S> = Vec::with_capacity(self.0.nodes.len());
        for term in self.terms() {
            values.push(match term {
                Term::Number(bits) => self.number(bits),
                Term::Parameter(index) => parameters[index],
                Term::X => x,
                Term::V => v,
                Term::Negative(of) => -values[of],
                Term::Binary(operation, a, b) => binary(operation, values[a], values[b]),
                Term::Call(function, of) => call(function, values[of]),
            });
        }
        values
    }

    /// The first term without a value at (`x`, `v`), or, if `series`, without a power series there.
    pub(super) fn fault<S: Scalar>(&self, parameters: &[S], x: f64, v: f64, series: bool) -> Option<DomainError> {
        let values = self.values(parameters, S::from_f64(x), S::from_f64(v));
        let value = |term: usize| values[term].value();
        let why = |index: usize, term: Term| {
            let expanded = series && self.0.varies[index];
            match term {
                Term::Binary(Binary::Divide, a, b) if value(b) == 0.0 => Some(Reason::DivisionByZero(value(a))),
                Term::Binary(Binary::Power, a, b) => {
                    let (base, exponent) = (value(a), value(b));
                    let is_whole = exponent.fract() == 0.0;
                    if base == 0.0 && exponent < 0.0 {
                        Some(Reason::DivisionByZero(1.0))
                    } else if base < 0.0 && !is_whole {
                        Some(Reason::PowerOfNegative { base, exponent })
                    } else if base == 0.0 && expanded && !(is_whole && values[b].is_constant()) {
                        Some(Reason::BranchPoint)
                    } else {
                        None
                    }
                }
                Term::Call(Function::Sqrt, of) if value(of) < 0.0 => Some(Reason::RootOfNegative(value(of))),
                Term::Call(Function::Sqrt, of) if value(of) == 0.0 && expanded => Some(Reason::BranchPoint),
                Term::Call(Function::Log | Function::Log10, of) if value(of) <= 0.0 => {
                    Some(Reason::LogarithmOfNotPositive(value(of)))
                }
                _ => None,
            }
            .or_else(|| (!value(index).is_finite()).then_some(Reason::NotFinite))
        };
        self.0.nodes.iter().enumerate().find_map(|(index, node)| {
            let reason = why(index, node.term)?;
            let term = quoted(&self.0.text[node.span.clone()]);
            Some(DomainError { span: node.span.clone(), term, reason, depth: x, velocity: v })
        })
    }
}

impl Program {
    fn new(text: String, nodes: Vec<Node>, parameters: Vec<f64>) -> Self {
        let mut places = std::collections::HashMap::with_capacity(nodes.len());
        let mut moved = Vec::with_capacity(nodes.len());
        let mut kept: Vec<Node> = Vec::with_capacity(nodes.len());
        let mut varies: Vec<bool> = Vec::with_capacity(nodes.len());
        let mut long_numbers = Vec::new();
        for Node { term, span } in nodes {
            if let Term::Number(bits) = term
                && is_long(text.get(span.clone()).unwrap_or_default())
            {
                long_numbers.push(bits);
            }
            let mut term = term.moved(|operand| moved[operand]);
            // A sum and a product are the same whichever operand comes first, to the last bit.
            if let Term::Binary(operation @ (Binary::Add | Binary::Multiply), a, b) = term {
                term = Term::Binary(operation, a.min(b), a.max(b));
            }
            let place = *places.entry(term).or_insert_with(|| {
                varies.push(matches!(term, Term::X | Term::V) || term.operands().any(|operand| varies[operand]));
                kept.push(Node { term, span });
                kept.len() - 1
            });
            moved.push(place);
        }
        Self { text, nodes: kept, varies, parameters, long_numbers, parts: OnceLock::new() }
    }
}

/// Whether a number has more than 15 digits, its exponent aside.
fn is_long(number: &str) -> bool {
    let digits = number.split(['e', 'E']).next().unwrap_or_default().trim_start_matches(['0', '.']);
    digits.bytes().filter(u8::is_ascii_digit).count() > 15
}

/// The value of a function.
pub(super) fn call<S: Scalar>(function: Function, of: S) -> S {
    match function {
        Function::Sqrt => of.sqrt(),
        Function::Exp => of.exp(),
        Function::Log => of.ln(),
        Function::Log10 => of.log10(),
        Function::Tanh => of.tanh(),
        Function::Sin => of.sin(),
        Function::Cos => of.cos(),
        Function::Atan => of.atan(),
        Function::Abs => of.select(of, -of),
    }
}

/// The value of an operation.
pub(super) fn binary<S: Scalar>(operation: Binary, a: S, b: S) -> S {
    match operation {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a.over(b),
        Binary::Power => a.powf(b),
        Binary::Min => (a - b).select(b, a),
        Binary::Max => (a - b).select(a, b),
    }
}

/// Why a term has no value.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Reason {
    /// A divisor is zero; the number is what is divided.
    #[error("{} is divided by zero", Shown(*.0))]
    DivisionByZero(f64),
    /// The square root of this negative number.
    #[error("the square root of {}", Shown(*.0))]
    RootOfNegative(f64),
    /// The logarithm of this number, which is zero or negative.
    #[error("the logarithm of {}", Shown(*.0))]
    LogarithmOfNotPositive(f64),
    /// A power of a negative number that is no whole one.
    #[error("{} to the power {}", Shown(*.base), Shown(*.exponent))]
    PowerOfNegative {
        /// The negative number.
        base: f64,
        /// The exponent.
        exponent: f64,
    },
    /// A root of zero: it has a value, and no power series.
    #[error("a root of zero cannot be expanded in a power series")]
    BranchPoint,
    /// The value is beyond the numbers of 64 bits, or made of such.
    #[error("the value is not finite in 64 bits")]
    NotFinite,
}

/// A term has no value at some depth and velocity.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{term} has no value at x = {} m, V = {} m/s: {reason}", Shown(*.depth), Shown(*.velocity))]
pub struct DomainError {
    /// Bytes of the term in the text of the expression.
    pub span: Range<usize>,
    /// The term in backticks.
    pub term: String,
    /// Why.
    pub reason: Reason,
    /// Depth x there (m).
    pub depth: f64,
    /// Velocity V there (m/s).
    pub velocity: f64,
}
