//! Which unit does a term have, and is it the one that is wanted there?
//!
//! Units are whole powers of kg, m and s. Roots are taken where they leave whole powers, so that no other are needed.

use std::fmt;

use strum::VariantArray;

use super::parse::{Binary, Function, Node, Term};
use super::{ExpressionError, Known, quoted};
use crate::physics::units::Dimension;

/// A product of whole powers of kg, m and s.
///
/// # Example
/// ```
/// use penetrode::physics::expression::Unit;
/// use penetrode::physics::units::Dimension;
/// let (drag, velocity) = (Unit::from(Dimension::Drag), Unit::from(Dimension::Velocity));
/// assert_eq!(velocity.power(2).and_then(|square| square.times(drag)), Some(Dimension::Force.into()));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Unit([i8; 3]);

impl From<Dimension> for Unit {
    fn from(dimension: Dimension) -> Self {
        Self(match dimension {
            Dimension::Mass => [1, 0, 0],
            Dimension::Length => [0, 1, 0],
            Dimension::Pressure => [1, -1, -2],
            Dimension::Density => [1, -3, 0],
            Dimension::Velocity => [0, 1, -1],
            Dimension::Force => [1, 1, -2],
            Dimension::Stiffness => [1, 0, -2],
            Dimension::Viscosity => [1, 0, -1],
            Dimension::Drag => [1, -1, 0],
            Dimension::Time => [0, 0, 1],
            Dimension::Energy => [1, 2, -2],
        })
    }
}

impl From<Option<Dimension>> for Unit {
    fn from(dimension: Option<Dimension>) -> Self {
        dimension.map_or(Self::NONE, Self::from)
    }
}

impl Unit {
    /// That of a plain number.
    pub const NONE: Self = Self([0; 3]);

    /// Each power by `combine` of its own and that of `other`; `None` beyond what fits.
    fn with(self, other: Self, combine: fn(i8, i8) -> Option<i8>) -> Option<Self> {
        let [[a, b, c], [d, e, f]] = [self.0, other.0];
        Some(Self([combine(a, d)?, combine(b, e)?, combine(c, f)?]))
    }

    /// The product of `powers` of dimensions; `None` for a power beyond 127.
    pub fn of(powers: &[(Dimension, i8)]) -> Option<Self> {
        powers.iter().try_fold(Self::NONE, |unit, (dimension, power)| unit.times(Self::from(*dimension).power(*power)?))
    }

    /// The unit of a product; `None` for a power beyond 127.
    pub fn times(self, other: Self) -> Option<Self> {
        self.with(other, i8::checked_add)
    }

    /// The unit of a quotient; `None` for a power beyond 127.
    pub fn over(self, other: Self) -> Option<Self> {
        self.with(other, i8::checked_sub)
    }

    /// The unit of a whole power; `None` for a power beyond 127.
    pub fn power(self, exponent: i8) -> Option<Self> {
        self.with(Self([exponent; 3]), i8::checked_mul)
    }

    /// The unit of a square root; `None` for an odd power.
    pub fn root(self) -> Option<Self> {
        self.0.iter().all(|power| power % 2 == 0).then(|| Self(self.0.map(|power| power / 2)))
    }

    fn dimension(self) -> Option<Dimension> {
        Dimension::VARIANTS.iter().copied().find(|dimension| Self::from(*dimension) == self)
    }

    /// As a thing with its unit: `a force (N)`, `a plain number`.
    pub fn described(self) -> String {
        if self == Self::NONE {
            return "a plain number".to_owned();
        }
        self.dimension().map_or_else(
            || self.to_string(),
            |dimension| {
                let noun = dimension.noun().split(" (").next().unwrap_or_default();
                let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
                format!("{article} {noun} ({self})")
            },
        )
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::NONE {
            return f.write_str("a plain number");
        }
        if let Some(dimension) = self.dimension() {
            return f.write_str(&dimension.symbol());
        }
        let product = |sign: i8| {
            let factor = |(name, power): (&str, i8)| match i16::from(power) * i16::from(sign) {
                ..=0 => None,
                1 => Some(name.to_owned()),
                2 => Some(format!("{name}²")),
                3 => Some(format!("{name}³")),
                power => Some(format!("{name}^{power}")),
            };
            ["kg", "m", "s"].into_iter().zip(self.0).filter_map(factor).collect::<Vec<_>>()
        };
        let (above, below) = (product(1), product(-1));
        let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match &below[..] {
            [] => f.write_str(&above),
            [one] => write!(f, "{above}/{one}"),
            several => write!(f, "{above}/({})", several.join(" ")),
        }
    }
}

/// What is known of a term on the way up.
#[derive(Clone, Copy)]
struct Found {
    /// `None` for zero, which is zero in any unit.
    unit: Option<Unit>,
    /// Its value if it is made of numbers alone.
    number: Option<f64>,
    /// Whether x or V is in it.
    varies: bool,
}

/// Refuses the terms `nodes` of `text` unless units fit all through, and the whole has the unit `wanted`; without one it is
/// the difference of the sides of an equation.
pub(super) fn check(
    text: &str,
    nodes: &[Node],
    known: &[Known<'_>],
    wanted: Option<Unit>,
) -> Result<(), ExpressionError> {
    let asked = asked(nodes, wanted);
    let mut found: Vec<Found> = Vec::with_capacity(nodes.len());
    let check = Check { text, nodes, equates: wanted.is_none() };
    for (index, node) in nodes.iter().enumerate() {
        let next = match node.term {
            Term::Number(bits) => {
                let value = f64::from_bits(bits);
                Found { unit: (value != 0.0).then_some(Unit::NONE), number: Some(value), varies: false }
            }
            Term::Parameter(parameter) => Found { unit: Some(known[parameter].unit), number: None, varies: false },
            Term::X => Found { unit: Some(Dimension::Length.into()), number: None, varies: true },
            Term::V => Found { unit: Some(Dimension::Velocity.into()), number: None, varies: true },
            Term::Negative(of) => Found { number: found[of].number.map(|value| -value), ..found[of] },
            Term::Call(function, of) => check.call(function, of, found[of])?,
            Term::Binary(binary, a, b) => check.binary(index, binary, (a, b), (found[a], found[b]), asked[index])?,
        };
        found.push(next);
    }
    match found.last().and_then(|whole| whole.unit).zip(wanted) {
        Some((unit, wanted)) if unit != wanted => {
            let span = nodes.last().map_or(0..text.len(), |node| node.span.clone());
            let message = format!("{} is {unit}, {} is wanted", quoted(&text[span.clone()]), wanted.described());
            Err(ExpressionError::new(span, message, wanted.described(), REMEDY))
        }
        _ => Ok(()),
    }
}

const REMEDY: &str = "multiply or divide by parameters with units; x is in m, V in m/s";

/// The unit that each term must have for what it is part of, where that says one.
fn asked(nodes: &[Node], wanted: Option<Unit>) -> Vec<Option<Unit>> {
    let mut asked = vec![None; nodes.len()];
    if let Some(last) = asked.last_mut() {
        *last = wanted;
    }
    for (index, node) in nodes.iter().enumerate().rev() {
        let unit = match node.term {
            Term::Negative(_)
            | Term::Call(Function::Abs, _)
            | Term::Binary(Binary::Add | Binary::Subtract | Binary::Min | Binary::Max, ..) => asked[index],
            Term::Binary(..) => None,
            _ => Some(Unit::NONE),
        };
        for operand in node.term.operands() {
            asked[operand] = unit;
        }
    }
    asked
}

struct Check<'a> {
    text: &'a str,
    nodes: &'a [Node],
    /// Whether the last term is the difference of the sides of an equation.
    equates: bool,
}

impl Check<'_> {
    fn quoted(&self, term: usize) -> String {
        quoted(&self.text[self.nodes[term].span.clone()])
    }

    /// The text of `term` divided by a parameter, for remedies.
    fn divided(&self, term: usize) -> String {
        match self.nodes[term].term {
            Term::V => "V/v1".to_owned(),
            Term::X => "x/x1".to_owned(),
            _ => "a/b".to_owned(),
        }
    }

    fn refuse<T>(
        &self,
        term: usize,
        message: String,
        label: impl Into<String>,
        help: impl Into<String>,
    ) -> Result<T, ExpressionError> {
        Err(ExpressionError::new(self.nodes[term].span.clone(), message, label, help))
    }

    fn call(&self, function: Function, of: usize, found: Found) -> Result<Found, ExpressionError> {
        let unit = found.unit.unwrap_or_default();
        let result = match function {
            Function::Abs => found.unit,
            Function::Sqrt => {
                let Some(root) = unit.root() else {
                    let message = format!("{} is {unit}, and its square root has no unit", self.quoted(of));
                    let help = format!("divide by a parameter of the same unit, as in `sqrt({})`", self.divided(of));
                    return self.refuse(of, message, "even powers of kg, m and s", help);
                };
                found.unit.map(|_| root)
            }
            _ if unit != Unit::NONE => {
                let name = function.name();
                let message = format!("{} is {unit}, and `{name}` takes a plain number", self.quoted(of));
                let help = format!("divide by a parameter of the same unit, as in `{name}({})`", self.divided(of));
                return self.refuse(of, message, "a plain number", help);
            }
            _ => Some(Unit::NONE),
        };
        let number = found.number.map(|value| super::tape::call(function, value));
        Ok(Found { unit: result, number, varies: found.varies })
    }

    fn binary(
        &self,
        index: usize,
        binary: Binary,
        (a, b): (usize, usize),
        (left, right): (Found, Found),
        asked: Option<Unit>,
    ) -> Result<Found, ExpressionError> {
        let unit = match binary {
            Binary::Add | Binary::Subtract | Binary::Min | Binary::Max => match (left.unit, right.unit) {
                (Some(one), Some(other)) if one != other => {
                    return self.unlike(binary, (a, b), (one, other), asked);
                }
                (one, other) => one.or(other),
            },
            Binary::Power => self.power((a, b), (left, right))?,
            Binary::Multiply | Binary::Divide => {
                let (one, other) = (left.unit.unwrap_or_default(), right.unit.unwrap_or_default());
                let unit = if binary == Binary::Multiply { one.times(other) } else { one.over(other) };
                Some(self.bounded(index, unit)?)
            }
        };
        let number = left.number.zip(right.number).map(|(left, right)| super::tape::binary(binary, left, right));
        Ok(Found { unit, number, varies: left.varies || right.varies })
    }

    fn bounded(&self, index: usize, unit: Option<Unit>) -> Result<Unit, ExpressionError> {
        unit.map_or_else(
            || {
                let message = format!("the unit of {} has a power beyond 127", self.quoted(index));
                self.refuse(index, message, "units to a power of at most 127", REMEDY)
            },
            Ok,
        )
    }

    /// Refuses the one of two terms that does not fit: the one that is not `asked` for, else the second.
    fn unlike<T>(
        &self,
        binary: Binary,
        (a, b): (usize, usize),
        (one, other): (Unit, Unit),
        asked: Option<Unit>,
    ) -> Result<T, ExpressionError> {
        let (term, unit, wanted) = match asked {
            Some(asked) if one != asked => (a, one, asked),
            Some(asked) => (b, other, asked),
            None => (b, other, one),
        };
        let deed = match binary {
            Binary::Add => "added",
            Binary::Subtract if !(self.equates && b + 2 == self.nodes.len()) => "subtracted",
            _ => "compared",
        };
        let message = format!("{} is {unit}, here {} is {deed}", self.quoted(term), wanted.described());
        if wanted == Unit::NONE {
            let help = format!("divide by a parameter of the same unit, as in `{}`", self.divided(term));
            return self.refuse(term, message, wanted.described(), help);
        }
        self.refuse(term, message, wanted.described(), REMEDY)
    }

    fn power(
        &self,
        (base, exponent): (usize, usize),
        (of, to): (Found, Found),
    ) -> Result<Option<Unit>, ExpressionError> {
        let unit = of.unit.unwrap_or_default();
        if to.varies {
            let message = format!("the exponent {} changes during the flight", self.quoted(exponent));
            return self.refuse(exponent, message, "numbers and parameters", "write a^b as `exp(b*log(a))`");
        }
        if to.unit.is_some_and(|unit| unit != Unit::NONE) {
            let message = format!("the exponent {} is {}", self.quoted(exponent), to.unit.unwrap_or_default());
            return self.refuse(exponent, message, "a plain number", REMEDY);
        }
        if unit == Unit::NONE {
            return Ok(Some(Unit::NONE));
        }
        let help = || {
            format!("divide by a parameter of the same unit, as in `({})^{}`", self.divided(base), {
                let Node { span, .. } = &self.nodes[exponent];
                crate::text::clipped(&crate::text::one_line(&self.text[span.clone()]), 20)
            })
        };
        let Some(number) = to.number else {
            let message =
                format!("{} is {unit}, and its exponent {} is a parameter", self.quoted(base), self.quoted(exponent));
            return self.refuse(base, message, "a base without unit, or a number as exponent", help());
        };
        if number.fract() != 0.0 {
            let message =
                format!("{} is {unit}, and has no unit to the power {}", self.quoted(base), self.quoted(exponent));
            return self.refuse(base, message, "a base without unit, or a whole exponent", help());
        }
        let power = (number.abs() <= 127.0).then(|| unit.power(number as i8)).flatten();
        self.bounded(base, power).map(Some)
    }
}
