//! Which force has a stage that names a table beside the scene, and where and why is it none?
//!
//! `force = { table = "r.csv", x = "depth_mm", force = "force_kN" }`, or `V = "speed_m_s"` in place of `x`: a CSV table, two of
//! its columns by their names, with the unit at the end of each. What is wrong in the table is underlined there, what names it wrongly in the scene.

use std::fs;
use std::path::Path;

use crate::exchange::diagnostic::{Fault, Span, did_you_mean, nearest, quoted, text_of};
use crate::exchange::input;
use crate::exchange::scene_file::shipped;
use crate::exchange::tables::{self, Format, Others, TableError, unit_at_end};
use crate::physics::force_table::{ForceTable, ROWS_MAX, Row, RowsRefused, SpeedTable};
use crate::physics::units::{Dimension, QuantityError, scaled};
use crate::physics::{Advice, Shown};

/// How the force of a stage is written as a table.
pub(super) const EXAMPLE: &str = "force = { table = \"r.csv\", x = \"depth_mm\", force = \"force_kN\" }";

/// The tables of shipped scenes, by their file names.
pub(super) const SHIPPED_TABLES: &[(&str, &str)] = &[
    ("softening.csv", include_str!("../../../verification/scenes/softening.csv")),
    ("law-speed-table.csv", include_str!("../../../verification/scenes/law-speed-table.csv")),
];

/// Largest table that is read (bytes): [`ROWS_MAX`] rows of many digits and columns.
const SIZE_MAX: u64 = 8 << 20;

/// Any columns, of which two are meant.
static FORMAT: Format = Format { columns: &[], others: Others::Read, has_comments: true };

/// A text of the scene and its place.
pub(super) type Word = (String, Span);

/// Reads the columns `x` and `force` of the file `table`, which stands beside the scene file `scene`.
pub(super) fn read(scene: &str, table: &Word, x: &Word, force: &Word) -> Result<ForceTable, Fault> {
    let (file, bytes) = bytes_of(scene, table)?;
    let text = text_of(bytes, &file).map_err(Fault::elsewhere)?;
    parse(&file, &text, &OF_DEPTH, x, force, ForceTable::new)
}

/// As [`read`], the columns `velocity` and `force`.
pub(super) fn read_of_velocity(scene: &str, table: &Word, velocity: &Word, force: &Word) -> Result<SpeedTable, Fault> {
    let (file, bytes) = bytes_of(scene, table)?;
    let text = text_of(bytes, &file).map_err(Fault::elsewhere)?;
    parse(&file, &text, &OF_VELOCITY, velocity, force, SpeedTable::new)
}

/// What a table goes by.
struct Over {
    dimension: Dimension,
    name: &'static str,
    unit: &'static str,
    column: &'static str,
}

const OF_DEPTH: Over = Over { dimension: Dimension::Length, name: "depth", unit: "m", column: "depth_mm" };
const OF_VELOCITY: Over = Over { dimension: Dimension::Velocity, name: "velocity", unit: "m/s", column: "speed_m_s" };

/// Name in messages and content of the table `name` beside `scene`.
fn bytes_of(scene: &str, (name, span): &Word) -> Result<(String, Vec<u8>), Fault> {
    let refuse = |why: String| {
        let allowed = "a CSV file, its path counted from the folder of the scene";
        Err(Fault::new(span.clone(), format!("the table {} {why}", quoted(name)), allowed, "check the path"))
    };
    let scene = Path::new(scene);
    let ships = !scene.exists() && scene.file_stem().and_then(|name| shipped(name.to_str()?)).is_some();
    let path = scene.parent().unwrap_or(Path::new("")).join(name);
    // As a scene that ships is read where there is no file of its name.
    let ships = ships || !path.exists();
    if let Some((known, text)) = SHIPPED_TABLES.iter().find(|(known, _)| ships && known == name) {
        return Ok(((*known).to_owned(), text.as_bytes().to_vec()));
    }
    // No pipe or device: it may have no end, or be the scene itself.
    match fs::metadata(&path) {
        Err(error) => return refuse(format!("cannot be read: {error}")),
        Ok(data) if !data.is_file() => return refuse("is no file".to_owned()),
        Ok(_) => {}
    }
    match input::read(&path, SIZE_MAX) {
        Ok(bytes) => Ok((path.display().to_string(), bytes)),
        Err(error) => refuse(format!("cannot be read: it {error}")),
    }
}

/// A column of the table: where it stands, and what its numbers are in.
struct Column {
    place: usize,
    /// SI value of the unit.
    coefficient: f64,
}

impl Column {
    /// The column `word` of a table with these `names`.
    fn find(names: &[String], (name, span): &Word, dimension: Dimension, example: &str) -> Result<Self, Fault> {
        let refuse = |message: String, allowed: String, help: String| Fault::new(span.clone(), message, allowed, help);
        let mut places = names.iter().enumerate().filter(|(_, known)| *known == name.trim());
        let Some((place, _)) = places.next() else {
            let known: Vec<_> = names.iter().map(String::as_str).collect();
            let help = nearest(name, &known).map_or_else(|| "name one of its columns".to_owned(), did_you_mean);
            let shown: Vec<_> = known.iter().take(8).map(|name| quoted(name)).collect();
            let message = format!("the table has no column {}", quoted(name));
            return Err(refuse(message, format!("one of {}", shown.join(", ")), help));
        };
        if places.next().is_some() {
            let message = format!("the table has the column {} twice", quoted(name));
            return Err(refuse(message, "a name that one column has".to_owned(), "rename one of the two".to_owned()));
        }
        let unit = unit_at_end(name, dimension);
        let Some(coefficient) = unit.and_then(|unit| dimension.coefficient(&unit)) else {
            return Err(refuse(
                format!("the name of the column {} ends in no unit of {}", quoted(name), dimension.noun()),
                format!("a name with its unit, such as {example}"),
                format!("rename the column, in {} and others", dimension.units().join(", ")),
            ));
        };
        Ok(Self { place, coefficient })
    }

    /// The SI value of `cell`, or why it is none.
    fn value(&self, cell: &str) -> Result<f64, &'static str> {
        let why = |error| match error {
            QuantityError::TooSmall => "too small for 64 bits",
            QuantityError::NotFinite => "not finite",
            _ => "not a number",
        };
        // With its unit as one decimal, rounded once.
        scaled(cell, self.coefficient).map_err(why)
    }
}

/// The table in `text`, the content of `file`.
fn parse<T>(
    file: &str,
    text: &str,
    over: &Over,
    at: &Word,
    force: &Word,
    new: fn(&[Row]) -> Result<T, RowsRefused>,
) -> Result<T, Fault> {
    let mut columns: Option<[Column; 2]> = None;
    let (mut lines, mut found) = (Vec::new(), None);
    let in_table = |line: u64, column: usize, message: String, allowed: &str, help: String| {
        Fault::new(span_of(text, line, column), message, allowed, help).in_table(file, text)
    };
    let rows = tables::read(file, text.as_bytes(), &FORMAT, |row| {
        // Ends the reading; the fault itself is found.
        let mut refuse = |fault: Fault| {
            found = Some(fault);
            TableError::of_row(row.at(), 0, tables::Fault::NoResults)
        };
        let [place, load] = if let Some(columns) = &columns {
            columns
        } else {
            let found = Column::find(row.names(), at, over.dimension, over.column)
                .and_then(|place| Ok([place, Column::find(row.names(), force, Dimension::Force, "force_kN")?]));
            columns.insert(found.map_err(&mut refuse)?)
        };
        if lines.len() == ROWS_MAX {
            let message = format!("the table has {}", RowsRefused::TooMany);
            let help = "keep every tenth row".to_owned();
            return Err(refuse(in_table(row.at().number(), 0, message, "fewer rows", help)));
        }
        lines.push(row.at().number());
        let mut number = |column: &Column| {
            let cell = row.cell(column.place)?;
            let value = column.value(cell);
            value.map_err(|why| {
                let message = if cell.is_empty() {
                    "this cell is empty".to_owned()
                } else {
                    format!("{} is {why}", quoted(cell))
                };
                let allowed = "a finite number";
                let help = "write it with a decimal point and without a unit, or remove the row".to_owned();
                refuse(in_table(row.at().number(), column.place + 1, message, allowed, help))
            })
        };
        Ok(Row { at: number(place)?, force: number(load)? })
    });
    let rows = match (rows, found) {
        (_, Some(fault)) => return Err(fault),
        (Ok(rows), None) => rows,
        (Err(error), None) => {
            let allowed = "a CSV table whose first line names its columns";
            let help = match error.fault {
                tables::Fault::Empty | tables::Fault::NoRows | tables::Fault::NoHeader => {
                    format!(
                        "begin with a line of names, such as {},force_kN, and a row for each {}",
                        over.column, over.name
                    )
                }
                _ => error.help(),
            };
            return Err(in_table(error.place.at.number(), error.place.column, error.fault.to_string(), allowed, help));
        }
    };
    let place = columns.map_or(0, |[place, _]| place.place + 1);
    let Over { name, unit, .. } = over;
    new(&rows).map_err(|refused| match refused {
        RowsRefused::NotRising { row, before } => in_table(
            lines[row],
            place,
            format!("this {name}, {} {unit}, is {refused} {unit}", Shown(rows[row].at)),
            &format!("a {name} beyond {} {unit}", Shown(before)),
            format!("order the rows by {name}, each {name} once; a jump takes two close together"),
        ),
        RowsRefused::NotFromRest(_) => in_table(
            lines.first().copied().unwrap_or_default(),
            place,
            refused.to_string(),
            "0 m/s in the first row",
            "add a row for 0 m/s: with the force of the next, where it is no other".to_owned(),
        ),
        RowsRefused::NotFinite { row } => {
            in_table(lines[row], 0, format!("this row is {refused}"), "finite numbers", "correct the row".to_owned())
        }
        RowsRefused::TooSteep { row } => in_table(
            lines[row],
            0,
            format!("the force of this row is {refused}"),
            "forces whose difference over that of the rows is finite",
            "check the units of both columns".to_owned(),
        ),
        RowsRefused::TooFew(_) | RowsRefused::TooMany => in_table(
            lines.last().copied().unwrap_or_default(),
            0,
            refused.to_string(),
            &format!("2 to {ROWS_MAX} rows"),
            "add rows, or give the coefficients of the stage".to_owned(),
        ),
    })
}

/// Bytes of the cell in `column`, from 1, of `line`, from 1; of the whole line for column 0, and where cells have quotes.
fn span_of(text: &str, line: u64, column: usize) -> Span {
    let mut start = 0;
    for line_text in text.split_inclusive('\n').take(usize::try_from(line.saturating_sub(1)).unwrap_or(usize::MAX)) {
        start += line_text.len();
    }
    let whole = text.get(start..).unwrap_or_default().split(['\n', '\r']).next().unwrap_or_default();
    if column == 0 || whole.contains('"') {
        return start..start + whole.len();
    }
    let mut from = start;
    for (index, cell) in whole.split(',').enumerate() {
        if index + 1 == column {
            let blank = cell.len() - cell.trim_start().len();
            let end = from + cell.len().max(1);
            return (from + blank).min(end)..(from + blank + cell.trim().len()).max(from + blank);
        }
        from += cell.len() + 1;
    }
    start..start + whole.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_of_a_cell_is_its_text_without_blanks() {
        let text = "a,b\n1, 22 ,\n\"3\",4\n";
        for (line, column, cell) in
            [(1, 2, "b"), (2, 1, "1"), (2, 2, "22"), (2, 3, ""), (3, 2, "\"3\",4"), (2, 0, "1, 22 ,")]
        {
            assert_eq!(text.get(span_of(text, line, column)), Some(cell), "{line}, {column}");
        }
        assert_eq!(span_of(text, 9, 1), text.len()..text.len());
    }
}
