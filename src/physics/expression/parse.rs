//! Which terms does a text have, each with its place in it?
//!
//! ```text
//! sum      = operand { operator operand }      operators by how tightly they bind: + -, then * /, then signs, then ^
//! operand  = number | name | function "(" sum [ "," sum ] ")" | "(" sum ")" | sign operand
//! ```
//!
//! `^` goes to the right. Terms stand in the order in which they can be computed: operands before what is made of them.

use std::ops::Range;

use winnow::Parser;
use winnow::combinator::{Infix, Prefix, alt, cut_err, expression, peek, separated};
use winnow::error::{ErrMode, ParserError};
use winnow::stream::{LocatingSlice, Location, Stateful, Stream};
use winnow::token::{any, one_of, take, take_while};

use super::{ExpressionError, Known, LENGTH_MAX, NESTING_MAX, quoted};
use crate::physics::units::{self, QuantityError};
use crate::text::{did_you_mean, nearest};

/// What a term is: a leaf, or an operation on terms by their index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Term {
    /// The bits of an f64: numbers are the same if their bits are.
    Number(u64),
    /// The known quantity of this index.
    Parameter(usize),
    /// Depth x (m).
    X,
    /// Velocity V (m/s).
    V,
    Negative(usize),
    Binary(Binary, usize, usize),
    Call(Function, usize),
}

/// What is made of two terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Min,
    Max,
}

/// A function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Function {
    Sqrt,
    Exp,
    Log,
    Log10,
    Tanh,
    Sin,
    Cos,
    Atan,
    Abs,
}

impl Term {
    pub(super) fn number(value: f64) -> Self {
        Self::Number(value.to_bits())
    }

    /// The terms that it is made of.
    pub(super) fn operands(self) -> impl Iterator<Item = usize> {
        let (first, second) = match self {
            Self::Number(_) | Self::Parameter(_) | Self::X | Self::V => (None, None),
            Self::Negative(of) | Self::Call(_, of) => (Some(of), None),
            Self::Binary(_, a, b) => (Some(a), Some(b)),
        };
        first.into_iter().chain(second)
    }

    /// The same operation on `at(operand)` for each operand.
    pub(super) fn moved(self, at: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::Number(_) | Self::Parameter(_) | Self::X | Self::V => self,
            Self::Negative(of) => Self::Negative(at(of)),
            Self::Call(function, of) => Self::Call(function, at(of)),
            Self::Binary(binary, a, b) => Self::Binary(binary, at(a), at(b)),
        }
    }
}

/// A term and the bytes of the text that it stands in, brackets around it included.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) term: Term,
    pub(super) span: Range<usize>,
}

/// What a name followed by a bracket stands for.
#[derive(Clone, Copy)]
enum Callee {
    One(Function),
    Two(Binary),
}

/// The functions by name.
const FUNCTIONS: [(&str, Callee); 11] = [
    ("sqrt", Callee::One(Function::Sqrt)),
    ("exp", Callee::One(Function::Exp)),
    ("log", Callee::One(Function::Log)),
    ("log10", Callee::One(Function::Log10)),
    ("tanh", Callee::One(Function::Tanh)),
    ("sin", Callee::One(Function::Sin)),
    ("cos", Callee::One(Function::Cos)),
    ("atan", Callee::One(Function::Atan)),
    ("abs", Callee::One(Function::Abs)),
    ("min", Callee::Two(Binary::Min)),
    ("max", Callee::Two(Binary::Max)),
];

/// Whether `name` is that of a function.
pub(super) fn is_function(name: &str) -> bool {
    FUNCTIONS.iter().any(|(function, _)| *function == name)
}

impl Function {
    pub(super) fn name(self) -> &'static str {
        let is_it = |callee: Callee| matches!(callee, Callee::One(function) if function == self);
        FUNCTIONS.iter().find(|(_, callee)| is_it(*callee)).map_or("", |(name, _)| name)
    }
}

/// Whether a name can begin with `c`.
fn begins_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

/// Whether a name can go on with `c`.
fn continues_name(c: char) -> bool {
    // Not all that is numeric: `V²` is no name.
    begins_name(c) || c.is_ascii_digit()
}

/// Whether `text` can be a name in an expression: letters, digits and `_`, no digit in front.
pub fn is_name(text: &str) -> bool {
    text.starts_with(begins_name) && text.chars().all(continues_name)
}

/// What the parser gathers, and what it looks up.
#[derive(Debug)]
struct State<'a> {
    text: &'a str,
    known: &'a [Known<'a>],
    nodes: Vec<Node>,
    /// Brackets, signs and exponents that are open.
    depth: usize,
}

type Input<'a> = Stateful<LocatingSlice<&'a str>, State<'a>>;

/// Why a text is refused.
#[derive(Debug)]
enum Refusal {
    /// No operand at this byte.
    NoOperand(usize),
    Because(Box<ExpressionError>),
}

type Fault = ErrMode<Refusal>;

impl ParserError<Input<'_>> for Refusal {
    type Inner = Self;

    fn from_input(input: &Input<'_>) -> Self {
        Self::NoOperand(input.current_token_start())
    }

    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}

/// An end of parsing: no other reading of the text is tried.
fn cut(span: Range<usize>, message: impl Into<String>, label: impl Into<String>, help: impl Into<String>) -> Fault {
    ErrMode::Cut(Refusal::Because(Box::new(ExpressionError::new(span, message, label, help))))
}

/// The terms of `text`, the whole of it last.
pub(super) fn parse(text: &str, known: &[Known<'_>]) -> Result<Vec<Node>, ExpressionError> {
    if text.len() > LENGTH_MAX {
        let (message, label) = (format!("the expression has {} bytes", text.len()), format!("at most {LENGTH_MAX}"));
        return Err(ExpressionError::new(0..text.len(), message, label, "write a table in its place"));
    }
    if text.trim().is_empty() {
        let help = "write one, such as \"P + Q*V^2\"";
        return Err(ExpressionError::new(0..text.len(), "the expression is empty", "an expression", help));
    }
    let state = State { text, known, nodes: Vec::new(), depth: 0 };
    let mut input = Input { input: LocatingSlice::new(text), state };
    let root = (space, sum).parse_next(&mut input).map(|_| ());
    let refusal = match root {
        Ok(()) if input.eof_offset() == 0 => return Ok(input.state.nodes),
        Ok(()) => unexpected(&input),
        Err(fault) => fault,
    };
    Err(match refusal {
        ErrMode::Cut(Refusal::Because(error)) | ErrMode::Backtrack(Refusal::Because(error)) => *error,
        ErrMode::Cut(Refusal::NoOperand(at)) | ErrMode::Backtrack(Refusal::NoOperand(at)) => no_operand(text, at),
        ErrMode::Incomplete(_) => no_operand(text, text.len()),
    })
}

fn space<'a>(input: &mut Input<'a>) -> Result<&'a str, Fault> {
    take_while(0.., char::is_whitespace).parse_next(input)
}

/// Operands joined by operators.
fn sum(input: &mut Input<'_>) -> Result<usize, Fault> {
    expression(operand).prefix(sign).infix(operator).parse_next(input)
}

const SUMS: i64 = 10;
const PRODUCTS: i64 = 20;
const SIGNS: i64 = 30;
const POWERS: i64 = 40;

fn sign<'a>(input: &mut Input<'a>) -> Result<Prefix<Input<'a>, usize, Fault>, Fault> {
    let sign = one_of(['-', '+']).parse_next(input)?;
    enter(input)?;
    space(input)?;
    let fold: fn(&mut Input<'a>, usize) -> Result<usize, Fault> = match sign {
        '-' => |input, of| Ok(negative(input, of)),
        _ => |input, of| {
            input.state.depth -= 1;
            Ok(of)
        },
    };
    Ok(Prefix(SIGNS, fold))
}

fn negative(input: &mut Input<'_>, of: usize) -> usize {
    input.state.depth -= 1;
    let Range { start, end } = input.state.nodes[of].span;
    // The sign is what stands in front of the operand.
    let start = input.state.text[..start].trim_end().len() - 1;
    push(input, Term::Negative(of), start..end)
}

fn operator<'a>(input: &mut Input<'a>) -> Result<Infix<Input<'a>, usize, Fault>, Fault> {
    let start = input.current_token_start();
    let sign = one_of(['+', '-', '*', '/', '^']).parse_next(input)?;
    if sign == '*' && input.starts_with('*') {
        return Err(cut(start..start + 2, "a power is written `^`", "`^`", "write `^`, as in `V^2`"));
    }
    space(input)?;
    Ok(match sign {
        '+' => Infix::Left(SUMS, |input, a, b| Ok(join(input, Binary::Add, a, b))),
        '-' => Infix::Left(SUMS, |input, a, b| Ok(join(input, Binary::Subtract, a, b))),
        '*' => Infix::Left(PRODUCTS, |input, a, b| Ok(join(input, Binary::Multiply, a, b))),
        '/' => Infix::Left(PRODUCTS, |input, a, b| Ok(join(input, Binary::Divide, a, b))),
        _ => {
            enter(input)?;
            Infix::Right(POWERS, |input, a, b| {
                input.state.depth -= 1;
                Ok(join(input, Binary::Power, a, b))
            })
        }
    })
}

fn join(input: &mut Input<'_>, binary: Binary, a: usize, b: usize) -> usize {
    let span = input.state.nodes[a].span.start..input.state.nodes[b].span.end;
    push(input, Term::Binary(binary, a, b), span)
}

fn push(input: &mut Input<'_>, term: Term, span: Range<usize>) -> usize {
    input.state.nodes.push(Node { term, span });
    input.state.nodes.len() - 1
}

/// Counts one bracket, sign or exponent more, each of which is a call deeper here.
fn enter(input: &mut Input<'_>) -> Result<(), Fault> {
    input.state.depth += 1;
    if input.state.depth <= NESTING_MAX {
        return Ok(());
    }
    let end = input.current_token_start();
    let message = format!("more than {NESTING_MAX} brackets, signs and exponents are open here");
    let start = input.state.text[..end].char_indices().next_back().map_or(0, |(start, _)| start);
    Err(cut(start..end, message, format!("at most {NESTING_MAX}"), "nest less deep"))
}

fn operand(input: &mut Input<'_>) -> Result<usize, Fault> {
    let operand = alt((number, name, group)).parse_next(input)?;
    space(input)?;
    Ok(operand)
}

fn number(input: &mut Input<'_>) -> Result<usize, Fault> {
    peek(one_of(('0'..='9', '.'))).parse_next(input)?;
    let start = input.current_token_start();
    let (digits, _) = units::split(&input.state.text[start..]);
    let digits = take(digits.len()).verify(|digits: &str| !digits.is_empty()).parse_next(input)?;
    let span = start..start + digits.len();
    match units::number(digits) {
        Ok(value) => Ok(push(input, Term::number(value), span)),
        Err(QuantityError::TooSmall) => {
            let message = format!("{} is below 2.3e-308, where 64 bits lose its digits", quoted(digits));
            Err(cut(span, message, "0, or a number from 2.3e-308 to 1.8e308", "write a larger number, or 0"))
        }
        Err(_) => {
            let message = format!("{} is beyond the largest number of 64 bits", quoted(digits));
            Err(cut(span, message, "a number below 1.8e308", "write a smaller number"))
        }
    }
}

fn name(input: &mut Input<'_>) -> Result<usize, Fault> {
    peek(any.verify(|c| begins_name(*c))).parse_next(input)?;
    let start = input.current_token_start();
    let name = take_while(1.., continues_name).parse_next(input)?;
    let span = start..start + name.len();
    let rest = &input.state.text[span.end..];
    if rest.trim_start().starts_with('(') {
        return call(input, name, span);
    }
    let known = input.state.known;
    let term = if let Some(index) = known.iter().position(|known| known.name == name) {
        Term::Parameter(index)
    } else {
        match name {
            "x" => Term::X,
            "V" => Term::V,
            "pi" => Term::number(std::f64::consts::PI),
            "e" => Term::number(std::f64::consts::E),
            _ => return Err(unknown_name(known, name, span)),
        }
    };
    Ok(push(input, term, span))
}

fn unknown_name(known: &[Known<'_>], name: &str, span: Range<usize>) -> Fault {
    /// Longest list of names in one line (bytes).
    const KNOWN_MAX: usize = 160;
    if is_function(name) {
        let help = format!("write `{name}(...)`");
        return cut(span, format!("the function {} has no brackets", quoted(name)), "brackets behind it", help);
    }
    let names: Vec<&str> =
        ["x", "V"].into_iter().chain(known.iter().map(|known| known.name)).chain(["pi", "e"]).collect();
    let add = || format!("add {} to [parameters], with its unit", quoted(name));
    let help = nearest(name, &names).map_or_else(add, did_you_mean);
    let mut names = names.join(", ");
    if names.len() > KNOWN_MAX {
        "x, V, pi, e and what [parameters] lists".clone_into(&mut names);
    }
    cut(span, format!("unknown name {}", quoted(name)), format!("known names: {names}"), help)
}

/// The call of `name`, whose bracket comes next.
fn call(input: &mut Input<'_>, name: &str, span: Range<usize>) -> Result<usize, Fault> {
    let Some((_, callee)) = FUNCTIONS.iter().find(|(function, _)| *function == name) else {
        let names = FUNCTIONS.map(|(name, _)| name);
        let is_quantity = is_quantity(name) || input.state.known.iter().any(|known| known.name == name);
        let help = match name {
            _ if is_quantity => format!("put an operator between them, as in `{name}*(...)`"),
            "ln" => did_you_mean("log"),
            "pow" => "write `a^b`".to_owned(),
            "tan" => "write `sin(a)/cos(a)`".to_owned(),
            _ => nearest(name, &names)
                .map_or_else(|| "write it with the functions that are known".to_owned(), did_you_mean),
        };
        let message = if is_quantity {
            format!("{} is no function", quoted(name))
        } else {
            format!("unknown function {}", quoted(name))
        };
        return Err(cut(span, message, format!("known functions: {}", names.join(", ")), help));
    };
    space(input)?;
    let open = input.current_token_start();
    '('.parse_next(input)?;
    enter(input)?;
    space(input)?;
    let arguments: Vec<usize> = separated(1.., cut_err(sum), (',', space)).parse_next(input)?;
    close(input, open, true)?;
    let span = span.start..input.previous_token_end();
    let term = match (callee, &arguments[..]) {
        (Callee::One(function), &[of]) => Term::Call(*function, of),
        (Callee::Two(binary), &[a, b]) => Term::Binary(*binary, a, b),
        (callee, _) => {
            let (takes, help) = match callee {
                Callee::One(_) => ("one argument", format!("write `{name}(a)`; decimals have a point: 1.5")),
                Callee::Two(_) => {
                    ("two arguments", format!("write `{name}(a, b)`, of three `{name}(a, {name}(b, c))`"))
                }
            };
            return Err(cut(
                span,
                format!("{} takes {takes}, here are {}", quoted(name), arguments.len()),
                takes,
                help,
            ));
        }
    };
    Ok(push(input, term, span))
}

/// Whether `name` stands for a number in each expression.
fn is_quantity(name: &str) -> bool {
    super::RESERVED.contains(&name)
}

fn group(input: &mut Input<'_>) -> Result<usize, Fault> {
    let open = input.current_token_start();
    '('.parse_next(input)?;
    enter(input)?;
    space(input)?;
    let inner = cut_err(sum).parse_next(input)?;
    close(input, open, false)?;
    // What is underlined later is the term with its brackets.
    input.state.nodes[inner].span = open..input.previous_token_end();
    Ok(inner)
}

/// The bracket that closes the one at `open`, between arguments or around a sum.
fn close(input: &mut Input<'_>, open: usize, arguments: bool) -> Result<(), Fault> {
    if input.eof_offset() == 0 {
        return Err(cut(open..open + 1, "`(` is not closed", "`)` is missing", "close it with `)`"));
    }
    if !input.starts_with(')') {
        if arguments && input.starts_with(',') {
            return Err(ErrMode::Cut(Refusal::NoOperand(input.current_token_start())));
        }
        return Err(unexpected(input));
    }
    ')'.parse_next(input)?;
    input.state.depth -= 1;
    Ok(())
}

/// The character at `at`, if any, with its bytes.
fn character(text: &str, at: usize) -> Option<(char, Range<usize>)> {
    let c = text[at..].chars().next()?;
    Some((c, at..at + c.len_utf8()))
}

/// The word at `at`: a name, a number, or one character.
fn word(text: &str, at: usize) -> Range<usize> {
    let rest = &text[at..];
    let named = rest.find(|c| !continues_name(c)).unwrap_or(rest.len());
    let length = units::split(rest).0.len().max(named).max(rest.chars().next().map_or(0, char::len_utf8));
    at..at + length
}

/// What to write in place of a character that is part of no expression.
fn replacement(c: char) -> &'static str {
    match c {
        '²' => "write `^2`",
        '³' => "write `^3`",
        '·' | '×' | '∙' | '⋅' => "write `*`",
        '÷' | ':' => "write `/`",
        '−' | '–' => "write `-`",
        '[' | '{' | ']' | '}' => "write `(` and `)`",
        '<' | '>' => "write `min(a, b)` or `max(a, b)`",
        '|' => "write `abs(a)`",
        _ => "remove it",
    }
}

const PARTS: &str = "names, numbers, `+ - * / ^`, brackets and functions";

/// What stands behind a whole expression, and cannot.
fn unexpected(input: &Input<'_>) -> Fault {
    let (text, at) = (input.state.text, input.current_token_start());
    let Some((c, span)) = character(text, at) else {
        return ErrMode::Cut(Refusal::NoOperand(at));
    };
    match c {
        _ if continues_name(c) || matches!(c, '(' | '.') => {
            let span = word(text, at);
            let message = format!("an operator is missing before {}", quoted(&text[span.clone()]));
            let help = "write `*` for a product; a number with a unit is a line of [parameters]";
            cut(span, message, "one of `+ - * / ^` before it", help)
        }
        ')' => cut(span, "`)` closes nothing", "as many `(` before it", "remove it, or open it with `(`"),
        ',' => cut(span, "a comma outside of `min` and `max`", PARTS, "decimals have a point: 1.5"),
        _ => cut(span, format!("{} is no part of an expression", quoted(&c.to_string())), PARTS, replacement(c)),
    }
}

/// Why there is no operand at `at`.
fn no_operand(text: &str, at: usize) -> ExpressionError {
    let before = text[..at].trim_end();
    let (message, span) = match (character(text, at), before.char_indices().next_back()) {
        (Some((c, span)), _) if !matches!(c, ')' | ',' | '*' | '/' | '^') => {
            let message = format!("{} is no part of an expression", quoted(&c.to_string()));
            return ExpressionError::new(span, message, PARTS, replacement(c));
        }
        (_, Some((start, c))) => {
            (format!("an operand is missing behind {}", quoted(&c.to_string())), start..before.len())
        }
        (Some((c, span)), None) => (format!("an operand is missing before {}", quoted(&c.to_string())), span),
        (None, None) => ("an operand is missing".to_owned(), at..at),
    };
    ExpressionError::new(
        span,
        message,
        "a number, a name, a function or `(`",
        "write what is missing, or remove the operator",
    )
}

/// `text` with the same spaces everywhere: around a sum's operators and behind a comma.
pub(super) fn normalized(text: &str) -> String {
    let mut output = String::with_capacity(text.len());
    let mut at = 0;
    while let Some((c, span)) = character(text, at) {
        let span = if continues_name(c) || c == '.' { word(text, at) } else { span };
        at = span.end;
        let follows_operand = output.ends_with(|c: char| continues_name(c) || matches!(c, ')' | '.'));
        match c {
            _ if c.is_whitespace() => {}
            ',' => output.push_str(", "),
            '+' | '-' if follows_operand => {
                output.extend([' ', c, ' ']);
            }
            _ => output.push_str(&text[span]),
        }
    }
    output
}
