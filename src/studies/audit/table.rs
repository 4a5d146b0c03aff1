//! A table of results over the step size, as another code gives it: reading, and what the digits printed mean.

use super::column::{Column, Heading, RESULTS};
use super::run::{End, Reading, Run, RunError, end_of};
use super::{AuditError, Finding, FindingKind};
use crate::exchange::tables::{self, At, Fault, Place, Row, TableError};
use crate::physics::units::{Dimension, quantity};
use crate::studies::quantity::Quantity;
use crate::text::shortened;

/// Rows of a table at most: each costs some tens of microseconds, and an order is as sure with a hundred.
pub const ROWS_MAX: usize = 10_000;

/// Columns of results at most: 10,000 rows of them are judged in a second.
const COLUMNS_MAX: usize = 64;

/// A table as read: steps ascending and different, one value each.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Its name in messages.
    pub(super) file: String,
    pub(super) rows: Vec<StepRow>,
    pub(super) columns: Vec<ResultColumn>,
    /// What was put right.
    pub(super) findings: Vec<Finding>,
}

/// A number as it stands in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    /// Its value, in SI units where the column is a quantity.
    pub(super) value: f64,
    /// Half a unit of the last digit printed, in the same unit.
    half_unit: f64,
    /// Digits printed, without zeros in front.
    digits: i32,
}

impl Cell {
    fn read(text: &str, unit: Option<&(Dimension, String)>) -> Option<Self> {
        let (value, half_unit, digits) = (parse(text)?, half_last_digit(text), significant_digits(text));
        let Some((dimension, unit)) = unit else { return Some(Self { value, half_unit, digits }) };
        // The decimal as a whole is converted and rounded once; what no unit takes is no finite number.
        let coefficient = dimension.coefficient(unit)?;
        let value = quantity(&format!("{text} {unit}"), *dimension).unwrap_or(value * coefficient);
        Some(Self { value, half_unit: half_unit * coefficient, digits })
    }
}

/// A row as it stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StepRow {
    pub(super) line: u64,
    /// Step (s).
    pub(super) step: f64,
    /// The step as printed.
    printed: Cell,
    /// The number of each column, if there is one.
    cells: Vec<Option<Cell>>,
}

impl StepRow {
    /// Value in `column`.
    pub(super) fn value(&self, column: &ResultColumn) -> f64 {
        self.cells[column.place].map_or(f64::NAN, |cell| cell.value)
    }
}

/// A column that is filled.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ResultColumn {
    pub(super) column: Column,
    /// Place in the file, from 0.
    place: usize,
    /// Half a unit of the last digit printed, the finest in the column: short numbers may be exact.
    pub(super) rounding: f64,
}

/// The names of the columns, one of them the step.
fn headings(row: &Row<'_>) -> Result<Vec<Heading>, Box<TableError>> {
    let refuse = |column, fault| {
        let place = Place { at: row.header(), column, ..Place::default() };
        TableError::new(place, fault, &RESULTS)
    };
    let mut headings: Vec<Heading> = Vec::new();
    for (index, name) in row.names().iter().enumerate() {
        let unknown = |near| refuse(index + 1, Fault::UnknownColumn { name: name.clone(), near });
        let heading = Heading::read(name).map_err(unknown)?;
        if headings.iter().any(|other| other.column == heading.column) {
            return Err(refuse(index + 1, Fault::ColumnTwice(name.clone())));
        }
        if index > COLUMNS_MAX {
            return Err(refuse(index + 1, Fault::TooManyColumns(COLUMNS_MAX)));
        }
        headings.push(heading);
    }
    let has_step = headings.iter().any(|heading| heading.column.is_none());
    if has_step { Ok(headings) } else { Err(refuse(0, Fault::MissingColumn(RESULTS.columns[0].name))) }
}

fn step_row(row: &Row<'_>, headings: &[Heading]) -> Result<StepRow, Box<TableError>> {
    let (mut step, mut cells) = (None, vec![None; headings.len()]);
    for (place, heading) in headings.iter().enumerate() {
        let text = row.cell(place)?;
        let refuse = |fault| TableError::of_row(row.at(), place + 1, fault);
        let bad = |reason: &'static str| {
            refuse(Fault::Cell { name: heading.name.clone().into(), text: shortened(text), reason: reason.into() })
        };
        let cell = match text {
            "" => None,
            text => Some(Cell::read(text, heading.unit.as_ref()).ok_or_else(|| bad("not a number"))?),
        };
        if heading.column.is_none() {
            if cell.is_some_and(|cell| cell.value <= 0.0) {
                return Err(bad("not a time above zero"));
            }
            step = cell;
        }
        cells[place] = cell;
    }
    let empty = || Fault::EmptyCell(RESULTS.columns[0].name.into());
    let printed = step.ok_or_else(|| TableError::of_row(row.at(), 0, empty()))?;
    Ok(StepRow { line: row.at().number(), step: printed.value, printed, cells })
}

impl Table {
    /// Reads a CSV table; `file` is its name in messages.
    ///
    /// A byte order mark, CRLF, quotes, blanks around cells, blank lines and lines that start with `#` are allowed.
    ///
    /// # Errors
    /// [`AuditError`] with the place: every cell must be a number (`nan` and `inf` are read, and fail later), every row
    /// complete, every name there once and none a known one written wrongly, every step positive, with one value; of [`ROWS_MAX`] rows at most.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, AuditError> {
        let (mut count, mut header, mut names) = (0, At::Table, Vec::new());
        let rows = tables::read(file, bytes, &RESULTS, |row| {
            count += 1;
            if count > ROWS_MAX {
                return Err(TableError::of_row(row.at(), 0, Fault::TooManyRows(ROWS_MAX)));
            }
            if count == 1 {
                (header, names) = (row.header(), headings(row)?);
            }
            step_row(row, &names)
        })?;
        let mut table = Self { file: file.to_owned(), rows, columns: Vec::new(), findings: Vec::new() };
        for (place, Heading { name, column, .. }) in names.into_iter().enumerate() {
            let Some(column) = column else { continue };
            let filled = table.rows.iter().filter_map(|row| row.cells[place]);
            let Some(rounding) = filled.map(|cell| cell.half_unit).reduce(f64::min) else {
                // A column of a template that was never filled says nothing; a gap in a column that is used hides something.
                table.remark(FindingKind::EmptyColumn, Some(column), "the column is empty and left out".to_owned());
                continue;
            };
            if let Some(row) = table.rows.iter().find(|row| row.cells[place].is_none()) {
                let fault = Fault::EmptyCell(name.into());
                return Err(TableError::of_row(At::Line(row.line), place + 1, fault).in_file(file).into());
            }
            table.columns.push(ResultColumn { column, place, rounding });
        }
        for index in (0..table.columns.len()).rev() {
            if table.counts_steps(&table.columns[index]) {
                let column = table.columns.remove(index).column;
                let message = format!("`{}` counts the steps of a run, has no limit, and is left out", column.name());
                table.remark(FindingKind::StepCount, Some(column), message);
            }
        }
        if table.columns.is_empty() {
            let place = Place { file: file.to_owned(), at: header, column: 0 };
            return Err(TableError::new(place, Fault::NoResults, &RESULTS).into());
        }
        table.put_in_order()?;
        Ok(table)
    }

    /// A table of the ends of runs, one a row, in the sequence of the files.
    ///
    /// # Errors
    /// [`AuditError::Run`] for a file that gives no row, or where one run leaves the target and another comes to rest;
    /// [`AuditError::Table`] as [`Self::read`], for the steps.
    pub fn of_runs(runs: &[Run], reading: &Reading) -> Result<Self, AuditError> {
        let refuse = |run: &Run, error| AuditError::Run(run.file.clone(), error);
        let mut table =
            Self { file: "the runs".to_owned(), rows: Vec::new(), columns: Vec::new(), findings: Vec::new() };
        let mut first: Option<bool> = None;
        for (run, line) in runs.iter().zip(1..) {
            let End { is_exit, state, rounding } = end_of(&run.text, reading).map_err(|error| refuse(run, error))?;
            if *first.get_or_insert(is_exit) != is_exit {
                return Err(refuse(run, RunError::Outcome { is_exit, other: runs[0].file.clone() }));
            }
            let values = if is_exit { [state.time, state.velocity] } else { [state.depth, state.time] };
            let half_units = if is_exit { [rounding[1], rounding[2]] } else { [rounding[0], rounding[1]] };
            let cell = |place: usize| Cell { value: values[place], half_unit: half_units[place], digits: 0 };
            let printed = Cell { value: run.step, half_unit: 0.0, digits: 0 };
            table.rows.push(StepRow { line, step: run.step, printed, cells: vec![Some(cell(0)), Some(cell(1))] });
        }
        let quantities = match first {
            Some(true) => [Quantity::Time, Quantity::Velocity],
            _ => [Quantity::Depth, Quantity::Time],
        };
        for (place, quantity) in quantities.into_iter().enumerate() {
            let half_units = table.rows.iter().filter_map(|row| row.cells[place]).map(|cell| cell.half_unit);
            let rounding = half_units.fold(f64::INFINITY, f64::min);
            table.columns.push(ResultColumn { column: Column::Quantity(quantity), place, rounding });
        }
        table.put_in_order()?;
        Ok(table)
    }

    /// Whether a column holds whole numbers that times their steps are one time, within two steps.
    fn counts_steps(&self, column: &ResultColumn) -> bool {
        let is_count = |row: &StepRow| row.value(column) >= 2.0 && row.value(column).fract() == 0.0;
        let times = |row: &StepRow| {
            let time = row.step * row.value(column);
            [time - 2.0 * row.step, time + 2.0 * row.step]
        };
        let [low, high] =
            self.rows.iter().map(times).fold([0.0, f64::INFINITY], |a, b| [a[0].max(b[0]), a[1].min(b[1])]);
        let differs = |row: &StepRow| row.value(column) != self.rows[0].value(column);
        column.column.quantity().is_none()
            && self.rows.iter().all(is_count)
            && self.rows.iter().any(differs)
            && low <= high
    }

    fn remark(&mut self, kind: FindingKind, column: Option<Column>, message: String) {
        self.findings.push(Finding { kind, quantity: column, message });
    }

    /// Sorts by step, merges equal rows, refuses two values at one step.
    fn put_in_order(&mut self) -> Result<(), AuditError> {
        // From coarse to fine is an order too.
        let rises = self.rows.windows(2).any(|pair| pair[0].step < pair[1].step);
        let falls = self.rows.windows(2).any(|pair| pair[0].step > pair[1].step);
        if rises && falls {
            let message = "the rows are not in the order of the step and were sorted".to_owned();
            self.remark(FindingKind::Unsorted, None, message);
        }
        self.rows.sort_by(|a, b| a.step.total_cmp(&b.step).then(a.line.cmp(&b.line)));
        let mut merged = Vec::new();
        let mut different: Vec<StepRow> = Vec::new();
        for row in std::mem::take(&mut self.rows) {
            let Some(before) = different.last().filter(|before| before.step == row.step) else {
                different.push(row);
                continue;
            };
            for column in &self.columns {
                let [first, second] = [before, &row].map(|row| row.value(column));
                // NaN twice is the same cell twice; -0 and 0 are one value.
                if first != second && !(first.is_nan() && second.is_nan()) {
                    let place = Place { file: self.file.clone(), at: At::Line(row.line), column: column.place + 1 };
                    let name = column.column.with_unit().into();
                    let (step, other) = (row.step, before.line);
                    let fault = Fault::TwoValues { step, name, first, second, other };
                    return Err(TableError::new(place, fault, &RESULTS).into());
                }
            }
            merged.push(row.line.to_string());
        }
        if !merged.is_empty() {
            let message = format!("{} repeated another row and was merged with it", lines(&merged));
            self.remark(FindingKind::DuplicateRows, None, message);
        }
        self.rows = different;
        Ok(())
    }

    /// Refuses a table of fewer than `needed` different steps.
    pub(super) fn holds_steps(&self, needed: usize) -> Result<(), AuditError> {
        let found = self.rows.iter().filter(|row| row.step.is_finite()).count();
        if found < needed {
            let place = Place { file: self.file.clone(), ..Place::default() };
            return Err(TableError::new(place, Fault::TooFewSteps { found, needed }, &RESULTS).into());
        }
        Ok(())
    }
}

/// What a row says of one flight.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FlightRow {
    /// Step (s).
    pub(crate) step: f64,
    /// Relative rounding of the step, zero for a short number, which is meant exactly.
    pub(crate) step_rounding: f64,
    /// Each finite value, in SI units, with half a unit of the last digit that its column is printed with.
    pub(crate) values: Vec<(Quantity, f64, f64)>,
}

/// Digits from which on a step counts as rounded: shorter ones, such as 2.5e-7, are meant exactly.
const ROUNDED_DIGITS: i32 = 6;

impl Table {
    /// The rows with values of one flight, steps ascending.
    ///
    /// Numbers lose zeros at their end. A column has a number of decimals or a number of digits; a cell is rounded to
    /// the finer of what it shows itself and the coarser of these two.
    pub(crate) fn flights(&self) -> Vec<FlightRow> {
        let columns: Vec<_> =
            self.columns.iter().filter_map(|column| Some((column, column.column.quantity()?))).collect();
        let columns = columns.into_iter().filter(|(_, quantity)| Quantity::OF_A_FLIGHT.contains(quantity));
        let digits = |column: &ResultColumn| {
            self.rows.iter().filter_map(|row| row.cells[column.place]).map(|cell| cell.digits).max()
        };
        let columns: Vec<_> =
            columns.map(|(column, quantity)| (column, quantity, digits(column).unwrap_or(0))).collect();
        let step_digits = self.rows.iter().map(|row| row.printed.digits).max().unwrap_or(0);
        let flight = |row: &StepRow| {
            let value = |&(column, quantity, digits): &(&ResultColumn, Quantity, i32)| {
                let cell = row.cells[column.place].filter(|cell| cell.value.is_finite())?;
                let as_digits = cell.half_unit * 10_f64.powi(cell.digits - digits);
                Some((quantity, cell.value, cell.half_unit.min(as_digits.max(column.rounding))))
            };
            let rounding = row.printed.half_unit * 10_f64.powi(row.printed.digits - step_digits) / row.step;
            let step_rounding = if step_digits < ROUNDED_DIGITS { 0.0 } else { rounding };
            FlightRow { step: row.step, step_rounding, values: columns.iter().filter_map(value).collect() }
        };
        let rows = self.rows.iter().filter(|row| row.step.is_finite()).map(flight);
        rows.filter(|row| !row.values.is_empty()).collect()
    }
}

/// Lines by their numbers, ten of them at most.
fn lines(lines: &[String]) -> String {
    let named = lines[..lines.len().min(10)].join(", ");
    match lines.len() {
        1 => format!("line {named}"),
        2..=10 => format!("each of lines {named}"),
        count => format!("each of lines {named} and {} more", count - 10),
    }
}

/// A number as codes print them, NaN and infinity included also as the Microsoft runtime writes them (`1.#IND`).
pub(super) fn parse(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    if lower.contains("#inf") {
        return Some(f64::INFINITY);
    }
    if lower.contains("#ind") || lower.contains("#qnan") || lower.starts_with("nan(") || lower.starts_with("-nan(") {
        return Some(f64::NAN);
    }
    text.parse().ok()
}

/// Digits of a decimal number without zeros in front.
fn significant_digits(text: &str) -> i32 {
    let mantissa = text.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.chars().filter(char::is_ascii_digit).skip_while(|&digit| digit == '0').count();
    i32::try_from(digits).unwrap_or(i32::MAX)
}

/// Half a unit of the last digit of a decimal number; zero for what has no digits.
pub(super) fn half_last_digit(text: &str) -> f64 {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    if !mantissa.contains(|c: char| c.is_ascii_digit()) {
        return 0.0;
    }
    let decimals = mantissa.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    let decimals = i32::try_from(decimals).unwrap_or(i32::MAX);
    exponent.parse::<i32>().map_or(0.0, |exponent| 0.5 * 10_f64.powi(exponent.saturating_sub(decimals)))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use super::*;

    fn refused(text: &str) -> AuditError {
        Table::read("run.csv", text.as_bytes()).unwrap_err()
    }

    const BASE: &str = "1e-6,1.01\n2e-6,1.04\n4e-6,1.16\n8e-6,1.64\n";

    #[test]
    fn more_rows_than_any_study_has_are_refused_at_the_first_of_them() {
        let rows = |count: usize| (1..=count).fold("dt_s,depth_m\n".to_owned(), |text, i| format!("{text}{i}e-9,1\n"));
        assert!(Table::read("run.csv", rows(ROWS_MAX).as_bytes()).is_ok());
        assert_eq!(refused(&rows(ROWS_MAX + 1)).to_string(), "run.csv:10002: more than 10000 rows");
    }

    #[test]
    fn merged_lines_are_named_up_to_ten() {
        let repeated = |count: usize| format!("dt_s,depth_m\n{BASE}{}", "1e-6,1.01\n".repeat(count));
        let message = |count| Table::read("run.csv", repeated(count).as_bytes()).unwrap().findings[1].message.clone();
        assert_eq!(message(1), "line 6 repeated another row and was merged with it");
        assert!(message(10).starts_with("each of lines 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 repeated"));
        assert!(message(11).starts_with("each of lines 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 and 1 more repeated"));
    }

    #[test]
    fn units_in_the_names_change_no_value_and_the_rounding_with_it() {
        let table = |text: &str| Table::read("run.csv", text.as_bytes()).unwrap();
        let si = table("dt_s,depth_m,velocity_m_s\n1e-6,0.1448,300\n2e-6,0.1451,310\n4e-6,0.15,320\n8e-6,nan,340\n");
        let others = table("dt_us,depth (mm),velocity_km_s\n1,144.8,0.300\n2,145.1,.310\n4,150.,0.32\n8,nan,0.340\n");
        assert_eq!(si.columns, others.columns);
        for (row, other) in si.rows.iter().zip(&others.rows) {
            assert_eq!((row.line, row.step), (other.line, other.step));
            for column in &si.columns {
                let [a, b] = [row.value(column), other.value(column)];
                assert!(a == b || a.is_nan() && b.is_nan(), "{a} {b}");
            }
        }
    }

    #[test]
    fn zeros_that_a_number_lost_at_its_end_still_count_as_printed() {
        // Seven digits, and four decimals; a number of six digits in the first column is one of seven.
        let text = "dt_s,time_s,depth_m\n1e-6,9.999999e-4,0.1448\n2e-6,1.000123e-3,10.1451\n4e-6,1.5e-3,0.2\n\
                    8e-6,1.00025e-3,3\n";
        let rows = Table::read("run.csv", text.as_bytes()).unwrap().flights();
        let halves = |place: usize| rows.iter().map(move |row| row.values[place].2);
        for (half, expected) in halves(0).zip([0.5e-10, 0.5e-9, 0.5e-9, 0.5e-9]).chain(halves(1).map(|h| (h, 0.5e-4))) {
            assert!((half / expected - 1.0).abs() < 1e-12, "{half:e} {expected:e}");
        }
        assert!(rows.iter().all(|row| row.step_rounding == 0.0), "short steps are exact");
        let thirds = Table::read("run.csv", b"dt_s,depth_m\n3.33333e-7,1\n6.66667e-7,1\n1e-6,1\n2e-6,1\n").unwrap();
        let rounding = thirds.flights()[0].step_rounding;
        assert!((rounding / (0.5e-12 / 3.33333e-7) - 1.0).abs() < 1e-12, "{rounding:e}");
    }

    #[test]
    fn a_step_and_every_quantity_are_there_once_whatever_the_unit() {
        for (names, message) in [
            ("depth_m,time_s", "run.csv:1: the column `dt_s` is missing"),
            ("dt_s,dt_us", "run.csv:1, column 2: the column `dt_us` is there twice"),
            ("dt_s,depth_m,depth_mm", "run.csv:1, column 3: the column `depth_mm` is there twice"),
            ("dt_s,force_n,force_n", "run.csv:1, column 3: the column `force_n` is there twice"),
            ("dt_s,dephts_m", "run.csv:1, column 2: there is no column `dephts_m`; is `depth_m` meant?"),
        ] {
            let row = ["1"; 3][..names.split(',').count()].join(",");
            assert_eq!(refused(&format!("{names}\n{row}\n")).to_string(), message);
        }
        let wide = |count: usize| (0..count).fold("dt_s".to_owned(), |names, index| format!("{names},force_{index}"));
        let row = "1,".repeat(COLUMNS_MAX + 1);
        let message = refused(&format!("{}\n{row}1\n", wide(COLUMNS_MAX + 1))).to_string();
        assert_eq!(message, "run.csv:1, column 66: more than 64 columns of results");
    }

    #[test]
    fn the_last_digit_printed_bounds_what_a_number_means() {
        for (text, half) in [("1.25", 0.005), ("3", 0.5), ("1.5e-6", 0.05e-6), ("2.50E+02", 0.5), ("nan", 0.0)] {
            assert!((half_last_digit(text) - half).abs() <= 1e-15 * half, "{text}");
        }
    }
}
