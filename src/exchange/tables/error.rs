//! Why can a table, or a row of it, not be used, where does that stand, and what is to be done?

use std::borrow::Cow;
use std::fmt;

use thiserror::Error;

use super::Format;
use crate::physics::Advice;
use crate::text::{Shown, count, shortened};

/// Line or row of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum At {
    /// The table as a whole.
    #[default]
    Table,
    /// Line of a text, from 1, as an editor counts.
    Line(u64),
    /// Row of a table without lines, from 1.
    Row(u64),
}

impl At {
    /// Number of the line or the row, from 1; 0 for the table.
    pub fn number(self) -> u64 {
        match self {
            Self::Table => 0,
            Self::Line(number) | Self::Row(number) => number,
        }
    }
}

/// Where something stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// File name as given; empty where the reader knows which file is meant.
    pub file: String,
    /// Line or row.
    pub at: At,
    /// Column, from 1; 0 for the whole line.
    pub column: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        let comma = if self.file.is_empty() { "" } else { ", " };
        match self.at {
            At::Table => {}
            At::Line(line) if self.file.is_empty() => write!(f, "line {line}")?,
            At::Line(line) => write!(f, ":{line}")?,
            At::Row(row) => write!(f, "{comma}row {row}")?,
        }
        if self.column > 0 { write!(f, ", column {}", self.column) } else { Ok(()) }
    }
}

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum Fault {
    #[error("{0}")]
    Unreadable(String),
    #[error("the table is empty: its first line must name the columns")]
    Empty,
    #[error("the table has no row below its first line")]
    NoRows,
    #[error("not text in UTF-8")]
    NotText,
    #[error("the first line must name the columns, and this one holds numbers")]
    NoHeader,
    #[error("there is no column `{}`{}", shortened(.name), .near.map_or(String::new(), |n| format!("; is `{n}` meant?")))]
    UnknownColumn { name: String, near: Option<&'static str> },
    #[error("the column `{}` is there twice", shortened(.0))]
    ColumnTwice(String),
    #[error("the column `{0}` is missing")]
    MissingColumn(&'static str),
    #[error("the column `{name}` holds {found}, not {expected}")]
    WrongType { name: Cow<'static, str>, found: String, expected: &'static str },
    #[error("compressed by {0}, which this program does not read")]
    Compressed(String),
    #[error("this line has no end within 1 MiB: it is no table, or a quote is not closed")]
    LineTooLong,
    #[error("a quote is opened and not closed in this line")]
    OpenQuote,
    #[error("{} in a table of {}", count(*.found, "cell"), count(*.expected, "column"))]
    Ragged { found: usize, expected: usize },
    #[error("more than {0} rows")]
    TooManyRows(usize),
    #[error("there is no column of results")]
    NoResults,
    #[error("more than {0} columns of results")]
    TooManyColumns(usize),
    #[error("the step {} s has two values of `{name}`, {} here and {} in line {other}", Shown(*.step), Shown(*.second), Shown(*.first))]
    TwoValues { step: f64, name: Cow<'static, str>, first: f64, second: f64, other: u64 },
    #[error("{found} different steps, and an order needs {needed}")]
    TooFewSteps { found: usize, needed: usize },
    #[error("{0}")]
    Row(String),
    #[error("the cell in `{0}` is empty")]
    EmptyCell(Cow<'static, str>),
    #[error("the row needs `{0}`, and the table has no such column")]
    NoColumnForRow(Cow<'static, str>),
    #[error("`{}` in `{name}` is {reason}", shortened(.text))]
    Cell { name: Cow<'static, str>, text: String, reason: Cow<'static, str> },
}

/// Why a table, or a row of it, cannot be used: a mistake of the caller, exit code 2.
#[derive(Clone, Debug, PartialEq)]
pub struct TableError {
    /// Where.
    pub place: Place,
    /// What.
    pub fault: Fault,
    /// What the table may hold: the end of the help for a fault of its columns.
    pub allowed: Cow<'static, str>,
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = if self.place == Place::default() { String::new() } else { format!("{}: ", self.place) };
        write!(f, "{at}{}", self.fault)
    }
}

impl std::error::Error for TableError {}

impl TableError {
    /// A fault at `place` of a table of `format`.
    pub fn new(place: Place, fault: Fault, format: &Format) -> Box<Self> {
        Box::new(Self { place, fault, allowed: format.allowed().into() })
    }

    /// A fault of a row, whose help needs no list of columns.
    pub fn of_row(at: At, column: usize, fault: Fault) -> Box<Self> {
        Box::new(Self { place: Place { at, column, ..Place::default() }, fault, allowed: Cow::Borrowed("") })
    }

    /// The same, in the file of this name.
    #[must_use]
    pub fn in_file(mut self: Box<Self>, file: &str) -> Box<Self> {
        file.clone_into(&mut self.place.file);
        self
    }
}

impl Advice for TableError {
    fn help(&self) -> String {
        let remedy = match &self.fault {
            Fault::Compressed(_) => "write the table without compression, or with Snappy",
            Fault::UnknownColumn { name, .. } if name.contains([';', '\t', char::REPLACEMENT_CHARACTER]) => {
                "separate the cells by commas, and write decimals with a point"
            }
            Fault::NotText => "save the table as CSV in UTF-8",
            Fault::OpenQuote | Fault::LineTooLong => "close the quote, or remove it",
            Fault::WrongType { .. } => "store numbers as DOUBLE, FLOAT or integers, and texts as UTF8",
            Fault::Ragged { .. } => "complete the row, or remove it",
            Fault::TooManyRows(_) => "keep every tenth row",
            Fault::TooManyColumns(_) => "keep the columns whose convergence is asked for",
            Fault::EmptyCell(_) => "fill the cell, or remove the row or the column",
            Fault::NoColumnForRow(_) => "add the column, or remove the row",
            Fault::Cell { reason, .. } if reason.contains("a number") => {
                "write numbers with a decimal point and without units: 1.25e-6"
            }
            Fault::Row(_) => "correct the row, or remove it",
            Fault::Cell { .. } => "correct the cell, or remove the row",
            Fault::ColumnTwice(_) => "remove one of the two",
            Fault::TwoValues { .. } => "keep one of them: a result that a step does not determine has no order",
            Fault::TooFewSteps { .. } => "run the other code with more steps, best at ratios of 1.5 to 2",
            Fault::NoResults => return format!("add a column of results; allowed are the {}", self.allowed),
            Fault::UnknownColumn { .. } => {
                return format!("rename the column, convert its unit, or remove it; allowed are the {}", self.allowed);
            }
            Fault::Unreadable(_) => return format!("name a table with the {}", self.allowed),
            Fault::Empty | Fault::NoRows | Fault::NoHeader | Fault::MissingColumn(_) => {
                return format!("begin with a line of names, separated by commas: the {}", self.allowed);
            }
        };
        remedy.to_owned()
    }
}
