//! How do tables come in and go out? From one list of columns, as CSV or as Parquet, a bounded number of rows at a time.
//!
//! A [`Format`] lists the columns of a table that comes in; a unit stands at the end of a column's name. [`CsvTable`]
//! and `parquet::ParquetTable` read it in chunks of [`Rows`], and a [`Row`] gives the cells by the index of the column
//! in that list. [`read`] goes through a small table in one call. A table that goes out is rows of [`Value`]s: lines of
//! CSV ([`push_line`]) or columns of [`Cells`]. Whatever is wrong is a [`TableError`].
//!
//! A row that cannot be used stops no other one. A table is refused as a whole only where no row could be trusted: a
//! first line that names no columns, or a quote that swallows the lines behind it.

pub mod csv;
pub mod error;
pub mod lines;
#[cfg(feature = "parquet")]
pub mod parquet;

use std::borrow::Cow;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use ::csv::ByteRecord;

pub use csv::CsvTable;
pub use error::{At, Fault, Place, TableError};

use super::input::{self, Unread, name_of};
use crate::physics::Range;
use crate::physics::units::{Dimension, QuantityError, number, scaled};
use crate::text::{Shown, shortened, steers};

/// Largest table that is read whole (bytes): a study of step sizes or a series of tests is some kilobytes.
const SIZE_MAX: u64 = 64 << 20;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Numbers from 1, never absent.
    Count,
    /// Real numbers.
    Number,
    /// Text.
    Text,
}

/// Whether a column, or a cell of it, may be absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Need {
    /// Every row gives it.
    Required,
    /// An absent cell is no number, or an empty text.
    Optional,
    /// As optional, and the table has this column or the one of the name here.
    Unless(&'static str),
    /// An absent cell is this number.
    Default(f64),
}

/// A column of a table that comes in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its name, the unit last.
    pub name: &'static str,
    /// What it holds.
    pub kind: Kind,
    /// Whether it may be absent.
    pub need: Need,
    /// Range of its numbers.
    pub range: Range,
    /// Its name without the unit, and what it measures: a table may then give it in another unit (`mass_g` for `mass_kg`).
    pub measure: Option<(&'static str, Dimension)>,
    /// Other names, without the unit where it has one: the symbols of a paper.
    pub aliases: &'static [&'static str],
}

impl Column {
    /// A required column of finite numbers.
    pub const fn number(name: &'static str) -> Self {
        Self { name, kind: Kind::Number, need: Need::Required, range: Range::Finite, measure: None, aliases: &[] }
    }

    /// The same in any unit of `dimension`, which stands behind `stem` in the name.
    #[must_use]
    pub const fn measured(self, stem: &'static str, dimension: Dimension) -> Self {
        Self { measure: Some((stem, dimension)), ..self }
    }

    /// The same, called by `aliases` too.
    #[must_use]
    pub const fn called(self, aliases: &'static [&'static str]) -> Self {
        Self { aliases, ..self }
    }

    /// What a number of the column `name` of a table at hand is in the unit of this one, as a factor; `None` where it is
    /// another column.
    fn factor(&self, name: &str) -> Option<f64> {
        if name == self.name {
            return Some(1.0);
        }
        let Some((stem, dimension)) = self.measure else { return self.aliases.contains(&name).then_some(1.0) };
        let coefficient = |unit: &str| {
            let is_alike = |known: &str| spellings(unit).iter().any(|unit| unit.to_lowercase() == known.to_lowercase());
            let exactly = spellings(unit).iter().find_map(|unit| dimension.coefficient(unit));
            // Names of columns are in small letters: `strength_mpa`.
            exactly.or_else(|| {
                dimension.units().iter().find(|known| is_alike(known)).and_then(|unit| dimension.coefficient(unit))
            })
        };
        // One name may begin another: `H` of `H_target_m`.
        let mut stems = [stem].into_iter().chain(self.aliases.iter().copied());
        stems.find_map(|stem| coefficient(unit_of(name.strip_prefix(stem)?).filter(|unit| !unit.is_empty())?))
    }

    /// Whether `name`, which is none of this column, may be meant for it: the whole, or with a unit at its end the part before
    /// it, is a name of the column but for a letter or two; for none where that is a word of less than five letters.
    pub fn may_be_meant(&self, name: &str) -> bool {
        let stem = self.measure.map(|(stem, _)| stem);
        let known = || [self.name].into_iter().chain(stem).chain(self.aliases.iter().copied());
        let ends =
            name.char_indices().filter(|(_, c)| self.measure.is_some() && "_ ([-".contains(*c)).map(|(end, _)| end);
        ends.chain([name.len()]).any(|end| known().any(|known| is_near(known, &name[..end])))
    }

    /// Whether `name`, which is none of this column, is one of its names written wrongly: the whole, or the part in front of a unit that fits,
    /// but for a letter or two. Words of less than five letters are too short to tell, and one with something else behind it is another.
    fn is_misspelt(&self, name: &str) -> bool {
        let (stem, dimension) = self.measure.unzip();
        let is_unit = |rest: &str| {
            let unit = dimension.zip(unit_of(rest));
            unit.is_some_and(|(of, unit)| spellings(unit).iter().any(|unit| of.coefficient(unit).is_some()))
        };
        let ends = name.char_indices().filter(|(end, c)| "_ ([".contains(*c) && is_unit(&name[*end..]));
        let parts: Vec<&str> = ends.map(|(end, _)| &name[..end]).chain([name]).collect();
        let is_long = |known: &&str| known.chars().filter(|c| c.is_alphanumeric()).count() >= 5;
        let mut known = [self.name].into_iter().chain(stem).chain(self.aliases.iter().copied()).filter(is_long);
        known.any(|known| parts.iter().any(|part| is_near(known, part)))
    }

    /// A required column of text.
    pub const fn text(name: &'static str) -> Self {
        Self { kind: Kind::Text, ..Self::number(name) }
    }

    /// The same with numbers within `range`.
    #[must_use]
    pub const fn within(self, range: Range) -> Self {
        Self { range, ..self }
    }

    /// The same, needed as `need` says.
    #[must_use]
    pub const fn needed(self, need: Need) -> Self {
        Self { need, ..self }
    }
}

/// Whether `read` is `known` but for letter case and separators, one letter of five to seven, two of more.
fn is_near(known: &str, read: &str) -> bool {
    let bare =
        |text: &str| text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect::<String>();
    let (known, read) = (bare(known), bare(read));
    let edits = match known.chars().count() {
        ..5 => 0,
        5..8 => 1,
        _ => 2,
    };
    !known.is_empty() && strsim::osa_distance(&known, &read) <= edits
}

/// The unit of `dimension` at the end of the name of a column, as units are written: `mm` of `depth_mm` and `x (mm)`, `m/s`
/// of `v_m_s`. The longest that is one.
pub fn unit_at_end(name: &str, dimension: Dimension) -> Option<String> {
    let starts = name.char_indices().filter(|(_, c)| "_ ([".contains(*c));
    starts
        .filter_map(|(start, _)| unit_of(&name[start..]))
        .find_map(|unit| spellings(unit).into_iter().find(|unit| dimension.coefficient(unit).is_some()))
}

/// The unit in the end of a name: `mm` of `_mm`, ` (mm)` and `[mm]`; empty where there is none, `None` where the name
/// goes on as a word.
pub(crate) fn unit_of(rest: &str) -> Option<&str> {
    let bare = rest.trim_start_matches(['_', ' ']);
    let inside = |open, close| bare.strip_prefix(open).and_then(|rest: &str| rest.strip_suffix(close));
    match inside('(', ')').or_else(|| inside('[', ']')) {
        Some(unit) => Some(unit.trim()),
        None if bare.len() < rest.len() || rest.is_empty() => Some(bare),
        None => None,
    }
}

/// A unit as a name writes it, and as units are written: `m_s` and `m_per_s` for `m/s`.
pub(crate) fn spellings(unit: &str) -> [String; 2] {
    [unit.to_owned(), unit.replace("_per_", "/").replace('_', "/")]
}

/// What becomes of columns that a [`Format`] does not name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Others {
    /// The table is refused.
    Refused,
    /// They are not read, and go with their rows ([`Row::kept`]). A name that may be meant for a column is refused.
    Kept,
    /// They are not read.
    Ignored,
    /// The caller reads them by [`Row::names`] and [`Row::cell`], and sees to it that none is missing or there twice.
    Read,
}

/// What a table that comes in may look like.
#[derive(Debug)]
pub struct Format {
    /// Its columns.
    pub columns: &'static [Column],
    /// What becomes of columns of other names.
    pub others: Others,
    /// Whether a line that begins with `#` is a comment.
    pub has_comments: bool,
}

impl Format {
    /// Its columns as the first line of a CSV table, without its end.
    pub fn header(&self) -> String {
        self.columns.iter().map(|column| column.name).collect::<Vec<_>>().join(",")
    }

    /// Whether a table whose columns have the `places` lacks `column`.
    fn lacks(&self, column: &Column, place: Option<usize>, places: &[Option<usize>]) -> bool {
        let has =
            |name: &str| self.columns.iter().zip(places).any(|(other, place)| other.name == name && place.is_some());
        match column.need {
            Need::Required => place.is_none(),
            Need::Unless(other) => place.is_none() && !has(other),
            Need::Optional | Need::Default(_) => false,
        }
    }

    /// Its columns in words.
    pub fn allowed(&self) -> String {
        let names = |is_needed: bool| {
            let of_kind = self
                .columns
                .iter()
                .filter(|column| matches!(column.need, Need::Required | Need::Unless(_)) == is_needed);
            let name = |column: &Column| match column.need {
                Need::Unless(other) => format!("{} (or {other})", column.name),
                _ => column.name.to_owned(),
            };
            of_kind.map(name).collect::<Vec<_>>().join(", ")
        };
        let (needed, optional) = (names(true), names(false));
        let mut text = match (needed.is_empty(), optional.is_empty()) {
            (true, _) => format!("any of the columns {optional}"),
            (false, true) => format!("columns {needed}"),
            (false, false) => format!("columns {needed}; these may be left out: {optional}"),
        };
        if self.others == Others::Read {
            text.push_str("; units as in dt_us and depth_mm, and further columns of numbers, are read too");
        }
        text
    }

    /// Whether a column `name` is kept.
    ///
    /// # Errors
    /// The known column that may be meant, or `None` for no name at all: a line with another separator is one.
    fn keeps(&self, name: &str) -> Result<(), Option<&'static str>> {
        if name.is_empty() || name.contains(['"', '=', '{', '}', ';']) || name.contains(char::is_control) {
            return Err(self.resembling(name));
        }
        let meant = self.columns.iter().find(|column| column.may_be_meant(name));
        meant.map_or(Ok(()), |column| Err(Some(column.name)))
    }

    /// The column whose name `name` resembles, if it is a word at all.
    fn resembling(&self, name: &str) -> Option<&'static str> {
        let is_word = name.chars().all(|c| c.is_alphanumeric() || "_ ()/".contains(c));
        let likeness = |known: &str| strsim::jaro_winkler(&known.to_lowercase(), &name.to_lowercase());
        let known = self.columns.iter().filter(|_| is_word).map(|column| (likeness(column.name), column.name));
        known.filter(|(likeness, _)| *likeness > 0.8).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, known)| known)
    }
}

/// Where each column of a [`Format`] stands in the table at hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    columns: &'static [Column],
    /// Index of each column, from 0.
    places: Vec<Option<usize>>,
    /// Its numbers in the unit of the format, over those in the table.
    factors: Vec<f64>,
    /// Names as they stand, without blanks at their ends, unknown ones among them.
    names: Vec<String>,
    /// Columns that the format does not have and the table keeps.
    kept: Vec<Kept>,
    /// Line of the names.
    header: At,
}

/// A column that goes unread with its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Its name.
    pub name: String,
    /// What it holds; a CSV table holds texts.
    pub kind: Kind,
    /// Its place in the table, from 0.
    place: usize,
}

impl Layout {
    /// The layout that the names of the columns describe; the first line is at `at` of `file`.
    ///
    /// # Errors
    /// [`TableError`]: an unknown, doubled or missing column, or numbers in place of names.
    pub fn new(names: &[&str], file: &str, at: At, format: &Format) -> Result<Self, Box<TableError>> {
        let refuse = |column, fault| Err(TableError::new(Place { file: file.to_owned(), at, column }, fault, format));
        if !names.is_empty() && names.iter().all(|name| name.trim().parse::<f64>().is_ok()) {
            return refuse(1, Fault::NoHeader);
        }
        let mut places = vec![None; format.columns.len()];
        let mut factors = vec![1.0; format.columns.len()];
        let mut kept: Vec<Kept> = Vec::new();
        for (index, name) in names.iter().map(|name| name.trim()).enumerate() {
            let known =
                format.columns.iter().enumerate().find_map(|(known, column)| Some((known, column.factor(name)?)));
            match known {
                Some((known, _)) if places[known].is_some() => {
                    return refuse(index + 1, Fault::ColumnTwice(name.to_owned()));
                }
                Some((known, factor)) => (places[known], factors[known]) = (Some(index), factor),
                // A line with another separator is one name.
                None if format.others == Others::Refused
                    || format.others == Others::Read && name.contains([';', '\t']) =>
                {
                    let near = format.resembling(name);
                    return refuse(index + 1, Fault::UnknownColumn { name: name.to_owned(), near });
                }
                None if format.others == Others::Ignored => {
                    if let Some(meant) = format.columns.iter().find(|column| column.is_misspelt(name)) {
                        let near = Some(meant.name);
                        return refuse(index + 1, Fault::UnknownColumn { name: name.to_owned(), near });
                    }
                }
                None if format.others == Others::Kept => {
                    if let Err(near) = format.keeps(name) {
                        return refuse(index + 1, Fault::UnknownColumn { name: name.to_owned(), near });
                    }
                    if kept.iter().any(|other| other.name == name) {
                        return refuse(index + 1, Fault::ColumnTwice(name.to_owned()));
                    }
                    kept.push(Kept { name: name.to_owned(), kind: Kind::Text, place: index });
                }
                _ => {}
            }
        }
        let names = names.iter().map(|name| name.trim().to_owned()).collect();
        let mut missing = format.columns.iter().zip(&places);
        match missing.find(|(column, place)| format.lacks(column, **place, &places)) {
            Some((column, _)) if format.others != Others::Read => refuse(0, Fault::MissingColumn(column.name)),
            _ => Ok(Self { columns: format.columns, places, factors, names, kept, header: at }),
        }
    }

    /// Place in the table, from 0, of each column of the format.
    pub fn places(&self) -> &[Option<usize>] {
        &self.places
    }

    /// Columns that the format does not have and the table keeps, in its order.
    pub fn kept(&self) -> &[Kept] {
        &self.kept
    }

    /// The columns that it keeps, which it no longer does: for a caller who has them at hand in their own types.
    pub fn take_kept(&mut self) -> Vec<Kept> {
        std::mem::take(&mut self.kept)
    }
}

impl Kept {
    /// Its place in the table, from 0.
    pub fn place(&self) -> usize {
        self.place
    }
}

/// Rows of a table, some thousands of them, with the layout to read them by.
#[derive(Debug)]
pub struct Rows {
    layout: Arc<Layout>,
    /// Rows in use; further records wait to be filled again.
    count: usize,
    data: Data,
}

#[derive(Debug)]
enum Data {
    /// Records of a CSV table, and the line of each.
    Csv(Vec<ByteRecord>, Vec<u64>),
    /// Columns of a table without lines in the order of the format, an empty one where the table has none, those that it keeps
    /// behind them, and the number of the first row, from 1.
    Columns(Vec<Cells>, u64),
}

impl Rows {
    /// Rows of a table in memory: `columns` in the order of the format of `layout`, without a cell where the table has no
    /// such column, and those that it keeps; the first is row `first`, from 1.
    ///
    /// # Panics
    /// If the columns are not those, or differ in length: a mistake of the caller.
    pub fn of_columns(layout: &Arc<Layout>, columns: Vec<Cells>, first: u64) -> Self {
        assert_eq!(columns.len(), layout.columns.len() + layout.kept.len(), "one entry a column");
        let count = columns.iter().map(Cells::len).max().unwrap_or(0);
        assert!(columns.iter().all(|cells| [0, count].contains(&cells.len())), "columns of one length");
        Self { layout: Arc::clone(layout), count, data: Data::Columns(columns, first) }
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The layout that they are read by.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Line or number of row `index` in its table.
    pub fn at(&self, index: usize) -> At {
        match &self.data {
            Data::Csv(_, lines) => At::Line(lines[index]),
            Data::Columns(_, first) => At::Row(first + index as u64),
        }
    }

    /// Row `index`, from 0.
    ///
    /// # Errors
    /// [`Fault::Ragged`].
    pub fn row(&self, index: usize) -> Result<Row<'_>, Box<TableError>> {
        let row = Row { rows: self, index };
        match &self.data {
            Data::Csv(records, _) if records[index].len() != self.layout.names.len() => {
                let fault = Fault::Ragged { found: records[index].len(), expected: self.layout.names.len() };
                Err(TableError::of_row(row.at(), 0, fault))
            }
            Data::Csv(..) | Data::Columns(..) => Ok(row),
        }
    }
}

/// A row of a table; columns are counted in the list of its [`Format`].
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    rows: &'a Rows,
    index: usize,
}

impl<'a> Row<'a> {
    /// Where it stands.
    pub fn at(&self) -> At {
        self.rows.at(self.index)
    }

    /// Where the columns are named.
    pub fn header(&self) -> At {
        self.rows.layout.header
    }

    /// Names of all columns in the order of the table.
    pub fn names(&self) -> &'a [String] {
        &self.rows.layout.names
    }

    /// The text at `place`, from 0, in the order of a CSV table, without blanks at its ends.
    ///
    /// # Errors
    /// [`Fault::NotText`].
    #[inline]
    pub fn cell(&self, place: usize) -> Result<&'a str, Box<TableError>> {
        match &self.rows.data {
            Data::Csv(records, _) => std::str::from_utf8(records[self.index].get(place).unwrap_or_default())
                .map(str::trim)
                .map_err(|_| TableError::of_row(self.at(), place + 1, Fault::NotText)),
            Data::Columns(..) => Ok(""),
        }
    }

    /// Position of `column` in the table, from 1; 0 where the table does not have it.
    pub fn position(&self, column: usize) -> usize {
        self.rows.layout.places[column].map_or(0, |place| place + 1)
    }

    /// The cells that the table keeps, in the order of [`Layout::kept`]; one that is no text is empty.
    pub fn kept(&self) -> impl Iterator<Item = Value<'a>> {
        let (row, layout) = (*self, &self.rows.layout);
        layout.kept.iter().enumerate().map(move |(index, kept)| match &row.rows.data {
            Data::Csv(..) => Value::Text(row.cell(kept.place).unwrap_or_default()),
            Data::Columns(columns, _) => match &columns[layout.columns.len() + index] {
                Cells::Texts(cells) => Value::Text(cells[row.index].as_deref().unwrap_or_default()),
                Cells::Numbers(cells) => Value::Number(cells[row.index]),
                Cells::Counts(cells) => Value::Count(cells[row.index]),
            },
        })
    }

    /// Refuses a cell that is not text, whether it is used or not.
    ///
    /// # Errors
    /// [`Fault::NotText`].
    pub fn check_text(&self) -> Result<(), Box<TableError>> {
        let bad = match &self.rows.data {
            Data::Csv(records, _) => records[self.index].iter().position(|cell| std::str::from_utf8(cell).is_err()),
            Data::Columns(..) => None,
        };
        bad.map_or(Ok(()), |column| Err(TableError::of_row(self.at(), column + 1, Fault::NotText)))
    }

    /// `fault` of the cell in `column`.
    fn refuse(&self, column: usize, fault: Fault) -> Box<TableError> {
        TableError::of_row(self.at(), self.position(column), fault)
    }

    /// The cell of `text` in `column` is `reason`.
    pub fn refuse_cell(&self, column: usize, text: &str, reason: impl Into<Cow<'static, str>>) -> Box<TableError> {
        let (name, text) = (self.name(column), shortened(text));
        self.refuse(column, Fault::Cell { name, text, reason: reason.into() })
    }

    /// The row as a whole is refused for `reason`.
    pub fn refuse_row(&self, reason: String) -> Box<TableError> {
        TableError::of_row(self.at(), 0, Fault::Row(reason))
    }

    /// The name that the table gives `column`.
    fn name(&self, column: usize) -> Cow<'static, str> {
        match self.rows.layout.places[column] {
            Some(place) => self.rows.layout.names[place].clone().into(),
            None => self.rows.layout.columns[column].name.into(),
        }
    }

    /// Places, from 0, and names of the columns that the format does not have.
    pub fn others(&self) -> impl Iterator<Item = (usize, &'a str)> {
        let layout = &self.rows.layout;
        let names = layout.names.iter().map(String::as_str).enumerate();
        names.filter(|(place, _)| !layout.places.contains(&Some(*place)))
    }

    /// The text in `column` without blanks at its ends; empty where it is absent.
    ///
    /// # Errors
    /// [`Fault::NotText`].
    #[inline]
    pub fn text(&self, column: usize) -> Result<&'a str, Box<TableError>> {
        let Some(place) = self.rows.layout.places[column] else { return Ok("") };
        match &self.rows.data {
            Data::Csv(..) => self.cell(place),
            Data::Columns(columns, _) => Ok(match &columns[column] {
                Cells::Texts(cells) => cells[self.index].as_deref().map_or("", str::trim),
                _ => "",
            }),
        }
    }

    /// The number in `column`, or its default; `None` where it is absent and has none.
    ///
    /// # Errors
    /// [`Fault::Cell`] and [`Fault::EmptyCell`].
    #[inline]
    pub fn optional(&self, column: usize) -> Result<Option<f64>, Box<TableError>> {
        let (Column { need, range, .. }, factor) = (self.rows.layout.columns[column], self.rows.layout.factors[column]);
        let refuse = |text: &str, error: Option<QuantityError>| {
            let reason: Cow<'static, str> = match (range, error) {
                (Range::Finite, Some(QuantityError::TooSmall)) => "too small for 64 bits".into(),
                (Range::Finite, Some(QuantityError::NoNumber)) => "not a number".into(),
                (Range::Finite, _) => "not finite".into(),
                _ => format!("not {}", range.description()).into(),
            };
            Err(self.refuse_cell(column, text, reason))
        };
        let value = match &self.rows.data {
            Data::Csv(..) => match self.text(column)? {
                "" => None,
                text => match if factor == 1.0 { number(text) } else { scaled(text, factor) } {
                    Ok(value) if range.contains(value) => return Ok(Some(value)),
                    other => return refuse(text, other.err()),
                },
            },
            Data::Columns(columns, _) => match &columns[column] {
                Cells::Numbers(cells) => cells.get(self.index).copied().flatten().map(|value| factor * value),
                _ => None,
            },
        };
        match (value, need) {
            (Some(value), _) if range.contains(value) => Ok(Some(value)),
            (Some(value), _) => refuse(&Shown(value).to_string(), None),
            (None, Need::Required) => Err(self.refuse_empty(column)),
            (None, Need::Optional | Need::Unless(_)) => Ok(None),
            (None, Need::Default(value)) => Ok(Some(value)),
        }
    }

    /// The number in `column`, which is required or has a default.
    ///
    /// # Errors
    /// As [`Row::optional`].
    #[inline]
    pub fn number(&self, column: usize) -> Result<f64, Box<TableError>> {
        self.optional(column)?.ok_or_else(|| self.refuse_empty(column))
    }

    /// The cell in `column` is empty, or there is no such column, and the row needs it.
    pub fn refuse_empty(&self, column: usize) -> Box<TableError> {
        let fault = if self.position(column) == 0 { Fault::NoColumnForRow } else { Fault::EmptyCell };
        self.refuse(column, fault(self.name(column)))
    }
}

/// Opens the table at `path`; `None` for `-`, standard input.
///
/// # Errors
/// [`Fault::Unreadable`]: a folder, or what the system says.
pub fn open(path: &Path, format: &Format) -> Result<Option<File>, Box<TableError>> {
    input::open(path).map_err(|cause| unreadable(path, &cause, format))
}

/// The table at `path` whole, `-` for standard input.
///
/// # Errors
/// [`Fault::Unreadable`]: as [`open`], or a table of more than 64 MiB.
pub fn read_bytes(path: &Path, format: &Format) -> Result<Vec<u8>, Box<TableError>> {
    input::read(path, SIZE_MAX).map_err(|cause| unreadable(path, &cause, format))
}

fn unreadable(path: &Path, cause: &Unread, format: &Format) -> Box<TableError> {
    let cause = match cause {
        Unread::TooLarge => "larger than 64 MiB, which no such table is".to_owned(),
        other => other.to_string(),
    };
    TableError::new(Place { file: name_of(path), ..Place::default() }, Fault::Unreadable(cause), format)
}

/// What `each` makes of the rows of the CSV table `bytes`, some at a time; `file` is its name in messages.
///
/// # Errors
/// [`TableError`] of the table, of its first bad row, or by `each`. Every cell must be text, used or not.
pub fn read<T>(
    file: &str,
    bytes: &[u8],
    format: &'static Format,
    each: impl FnMut(&Row<'_>) -> Result<T, Box<TableError>>,
) -> Result<Vec<T>, Box<TableError>> {
    read_rows(file, bytes, format, each)?.into_iter().collect()
}

/// As [`read`], with the fault of a row in its place.
///
/// # Errors
/// [`TableError`] of the table.
pub fn read_rows<T>(
    file: &str,
    bytes: &[u8],
    format: &'static Format,
    mut each: impl FnMut(&Row<'_>) -> Result<T, Box<TableError>>,
) -> Result<Vec<Result<T, Box<TableError>>>, Box<TableError>> {
    let mut table = CsvTable::new(file, bytes, format)?;
    let (mut all, mut used) = (Vec::new(), None);
    loop {
        let records = table.next_rows(256, used.take())?;
        if records.is_empty() {
            let place = Place { file: file.to_owned(), ..Place::default() };
            return if all.is_empty() { Err(TableError::new(place, Fault::NoRows, format)) } else { Ok(all) };
        }
        for index in 0..records.len() {
            let made = records.row(index).and_then(|row| row.check_text().and_then(|()| each(&row)));
            all.push(made.map_err(|error| error.in_file(file)));
        }
        used = Some(records);
    }
}

/// A cell of a table that goes out; an empty text is an absent one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// Of [`Kind::Count`].
    Count(u64),
    /// Of [`Kind::Number`].
    Number(Option<f64>),
    /// Of [`Kind::Text`].
    Text(&'a str),
}

/// Appends `values` as a line of CSV with its end.
pub fn push_line(line: &mut String, values: &[Value<'_>]) {
    for (index, value) in values.iter().enumerate() {
        if index > 0 {
            line.push(',');
        }
        match value {
            // Writing to a string cannot fail.
            Value::Count(count) => drop(write!(line, "{count}")),
            Value::Number(Some(number)) => push_number(line, *number),
            Value::Number(None) => {}
            Value::Text(text) => push_text(line, text),
        }
    }
    line.push('\n');
}

/// The shortest digits that read back to the same number; with an exponent where there would be many zeros.
pub fn push_number(text: &mut String, value: f64) {
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format(value);
    text.push_str(digits.strip_suffix(".0").unwrap_or(digits));
}

/// A text as one CSV cell of one line, quoted unless it is a word.
///
/// One that begins like a formula has a `'` in front, as spreadsheets have it; the text of a number keeps its sign.
fn push_text(line: &mut String, text: &str) {
    // Nearly all texts: no message, or an outcome.
    if text.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
        return line.push_str(text);
    }
    let is_formula = text.starts_with(['=', '+', '-', '@']) && text.parse::<f64>().is_err();
    if is_formula {
        return push_text(line, &format!("'{text}"));
    }
    if text.chars().all(|c| c.is_alphanumeric() || c == '-' || c == '_') {
        return line.push_str(text);
    }
    line.push('"');
    for c in text.chars() {
        if c == '"' {
            line.push('"');
        }
        line.push(printable(c));
    }
    line.push('"');
}

/// A character as a text in a table may have it: a cell is one line.
fn printable(c: char) -> char {
    if steers(c) { ' ' } else { c }
}

/// Cells of one column, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Of [`Kind::Count`].
    Counts(Vec<u64>),
    /// Of [`Kind::Number`].
    Numbers(Vec<Option<f64>>),
    /// Of [`Kind::Text`].
    Texts(Vec<Option<String>>),
}

impl Cells {
    /// No cell of `kind`.
    pub fn empty(kind: Kind) -> Self {
        match kind {
            Kind::Count => Self::Counts(Vec::new()),
            Kind::Number => Self::Numbers(Vec::new()),
            Kind::Text => Self::Texts(Vec::new()),
        }
    }

    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(cells) => cells.len(),
            Self::Numbers(cells) => cells.len(),
            Self::Texts(cells) => cells.len(),
        }
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends `cells`.
    ///
    /// # Panics
    /// If they are of another kind: a mistake of the caller.
    pub fn append(&mut self, cells: Self) {
        match (self, cells) {
            (Self::Counts(all), Self::Counts(cells)) => all.extend(cells),
            (Self::Numbers(all), Self::Numbers(cells)) => all.extend(cells),
            (Self::Texts(all), Self::Texts(cells)) => all.extend(cells),
            (all, cells) => unreachable!("{cells:?} behind {all:?}"),
        }
    }

    /// Appends `value`.
    ///
    /// # Panics
    /// If it is of another kind: a mistake of the caller.
    pub fn push(&mut self, value: Value<'_>) {
        match (self, value) {
            (Self::Counts(cells), Value::Count(count)) => cells.push(count),
            (Self::Numbers(cells), Value::Number(number)) => cells.push(number),
            (Self::Texts(cells), Value::Text(text)) => {
                cells.push((!text.is_empty()).then(|| text.chars().map(printable).collect()));
            }
            (cells, value) => unreachable!("{value:?} in {cells:?}"),
        }
    }
}

/// Name and kind of each column of a table that goes out.
pub type Columns<'a> = [(&'a str, Kind)];

/// Rows of a table that goes out, made apart from it: on another thread, say.
#[derive(Debug)]
pub enum Block {
    /// Lines of CSV.
    Lines(String),
    /// Columns of a Parquet table.
    Columns(Vec<Cells>),
}

impl Block {
    /// No row of a table with `columns`.
    pub fn empty(columns: &Columns<'_>, is_parquet: bool) -> Self {
        if is_parquet {
            Self::Columns(columns.iter().map(|(_, kind)| Cells::empty(*kind)).collect())
        } else {
            Self::Lines(String::new())
        }
    }

    /// Adds a row, one value a column.
    pub fn push(&mut self, row: &[Value<'_>]) {
        match self {
            Self::Lines(lines) => push_line(lines, row),
            Self::Columns(columns) => columns.iter_mut().zip(row).for_each(|(cells, value)| cells.push(*value)),
        }
    }
}

/// A table that is being written, as CSV or as Parquet.
pub enum TableWriter<W: Write + Send> {
    /// Lines, the first with the names of the columns.
    Csv(W),
    /// Row groups.
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet::ParquetWriter<W>>),
}

impl<W: Write + Send> TableWriter<W> {
    /// A table with `columns`; `is_parquet` is false in a build that does without.
    ///
    /// # Errors
    /// When `output` cannot be written.
    pub fn new(mut output: W, columns: &Columns<'_>, is_parquet: bool) -> io::Result<Self> {
        #[cfg(feature = "parquet")]
        if is_parquet {
            return Ok(Self::Parquet(Box::new(parquet::ParquetWriter::new(output, columns)?)));
        }
        debug_assert!(!is_parquet, "this build writes CSV only");
        let quoted = |name: &str| {
            let is_plain = !name.contains([',', '"']);
            if is_plain { name.to_owned() } else { format!("\"{}\"", name.replace('"', "\"\"")) }
        };
        let names: Vec<_> = columns.iter().map(|(name, _)| quoted(name)).collect();
        writeln!(output, "{}", names.join(","))?;
        Ok(Self::Csv(output))
    }

    /// Adds the rows of `block`, which is of the format of the table.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn push(&mut self, block: Block) -> io::Result<()> {
        match (self, block) {
            (Self::Csv(output), Block::Lines(lines)) => output.write_all(lines.as_bytes()),
            #[cfg(feature = "parquet")]
            (Self::Parquet(table), Block::Columns(columns)) => table.push(columns),
            _ => unreachable!("a block of another format"),
        }
    }

    /// Writes what is left to write, and gives the output back.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn finish(self) -> io::Result<W> {
        match self {
            Self::Csv(output) => Ok(output),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.finish(),
        }
    }
}

/// The bytes of a table of these `rows`.
///
/// # Errors
/// When there is no memory for it.
pub fn table_of<'a>(
    columns: &Columns<'_>,
    is_parquet: bool,
    rows: impl IntoIterator<Item = Vec<Value<'a>>>,
) -> io::Result<Vec<u8>> {
    let mut block = Block::empty(columns, is_parquet);
    rows.into_iter().for_each(|row| block.push(&row));
    let mut table = TableWriter::new(Vec::new(), columns, is_parquet)?;
    table.push(block)?;
    table.finish()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_one_cell_of_one_line_and_no_formula() {
        for (text, cell) in [
            ("=1+1", "\"'=1+1\""),
            ("@SUM(A1)", "\"'@SUM(A1)\""),
            ("+cmd", "\"'+cmd\""),
            ("-1.5e-3", "\"-1.5e-3\""),
            ("a,\"b\"\n", "\"a,\"\"b\"\" \""),
            ("\u{1b}[31mred", "\" [31mred\""),
            ("word", "word"),
        ] {
            let mut line = String::new();
            push_text(&mut line, text);
            assert_eq!(line, cell);
        }
    }

    #[test]
    fn numbers_read_back_to_the_same_number() {
        for value in [0.0_f64, -0.0, 1.0 / 3.0, 5e-324, 1.797e308, 1e-7, 123_456_789.125, -2.5e-12] {
            let mut text = String::new();
            push_number(&mut text, value);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            // As in a message, but for the sign of an exponent.
            assert_eq!(text.replace("e+", "e"), Shown(value).to_string());
        }
    }
}
