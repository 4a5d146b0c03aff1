//! What does a line of text such as `P + Q*V^2` say, and what is its value, its derivatives, its power series?
//!
//! ```text
//! text ──parse──> terms with places ──units──> Tape ──bind(parameters)──> Bound ──> eval, gradient, Jets
//! ```
//!
//! An expression has depth x (m), velocity V (m/s), quantities known by name, `pi`, `e`, numbers, `+ - * / ^`, brackets, and
//! the functions sqrt, exp, log (natural), log10, tanh, sin, cos, atan, abs, min and max (of two). `^` binds tightest and to the
//! right; a sign before a power is outside it: `-x^2` is `-(x^2)`. Names are case-sensitive.
//!
//! **Units** are checked all through ([`Unit`]): terms of a sum have the same unit, exponents are constant, and not whole
//! only over a base without unit; sqrt takes even powers of units, abs, min and max keep theirs, other functions want a
//! plain number. Zero has any unit, so that `max(F, 0)` needs no parameter.
//!
//! **Number types** are those of [`super::elementary`]: f64, dual numbers, double-doubles. A number of the text, `pi` and `e` are
//! the nearest f64 in each of them.
//!
//! **Kinks.** `abs`, `min` and `max` choose by the sign of a *switch*, a register of its own. A series stays on the sides it
//! was started with, so that a step of an integrator is smooth, and the switch's own series shows where it ends.

mod bound;
mod disc;
mod jets;
mod parse;
mod polynomial;
mod range;
mod tape;
#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a missing value is a failed test")]
mod tests;
mod unit;

use std::ops::Range;

use thiserror::Error;

pub use bound::Bound;
pub(crate) use disc::{Around, Disc};
pub(crate) use jets::product;
pub use jets::{Fall, Falling, Jets};
pub use parse::is_name;
pub use tape::{DomainError, Reason, Tape};
pub use unit::Unit;

/// Longest expression that is read (bytes).
pub const LENGTH_MAX: usize = 4096;

/// Most brackets, signs and exponents that may be open at one place.
pub const NESTING_MAX: usize = 64;

/// Names that every expression knows, and no quantity may have; nor that of a function.
pub const RESERVED: [&str; 4] = ["x", "V", "pi", "e"];

/// Whether `name` stands for something in every expression, so that no quantity may have it.
pub fn is_reserved(name: &str) -> bool {
    RESERVED.contains(&name) || parse::is_function(name)
}

/// A quantity that expressions use by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known<'a> {
    /// Its name: see [`is_name`] and [`RESERVED`].
    pub name: &'a str,
    /// Its value, in SI units.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
}

/// Why a text is no expression of the wanted unit.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{message}")]
pub struct ExpressionError {
    /// Bytes of the offending text.
    pub span: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// What is allowed there.
    pub label: String,
    /// What to do.
    pub help: String,
}

impl ExpressionError {
    fn new(span: Range<usize>, message: impl Into<String>, label: impl Into<String>, help: impl Into<String>) -> Self {
        Self { span, message: message.into(), label: label.into(), help: help.into() }
    }
}

/// A piece of an expression within a message: one line, bounded, in backticks.
fn quoted(text: &str) -> String {
    /// Longest piece that is shown whole, in characters.
    const QUOTE_MAX: usize = 60;
    format!("`{}`", crate::text::clipped(&crate::text::one_line(text), QUOTE_MAX))
}
