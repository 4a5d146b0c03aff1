//! A table of results over the step size, as another code gives it: reading, and what the digits printed mean.

use super::{AuditError, Finding, FindingKind};
use crate::exchange::tables::{self, At, Column, Fault, Format, Need, Place, Row, TableError};
use crate::studies::order::STEPS_MIN;
use crate::studies::quantity::Quantity;

/// Rows of a table at most: each costs some tens of microseconds, and an order is as sure with a hundred.
pub const ROWS_MAX: usize = 10_000;

/// A table of results over the step size, the quantities in the order of [`Quantity::ALL`] behind the step.
pub static RESULTS: Format = Format {
    columns: &[
        Column::number("dt_s"),
        Column::number("depth_m").needed(Need::Optional),
        Column::number("time_s").needed(Need::Optional),
        Column::number("velocity_m_s").needed(Need::Optional),
        Column::number("crater_end_time_s").needed(Need::Optional),
        Column::number("crater_end_velocity_m_s").needed(Need::Optional),
        Column::number("critical_velocity_m_s").needed(Need::Optional),
    ],
    ignores_others: false,
    has_comments: true,
};

/// Column of `quantity` in [`RESULTS`].
fn column_of(quantity: Quantity) -> usize {
    quantity as usize + 1
}

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

/// A row as it stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StepRow {
    pub(super) line: u64,
    /// Step (s).
    pub(super) step: f64,
    /// For each quantity the value and half a unit of its last digit, if there is one.
    cells: [Option<(f64, f64)>; Quantity::ALL.len()],
}

impl StepRow {
    /// Value of `quantity`, of which the table has a column.
    pub(super) fn value(&self, quantity: Quantity) -> f64 {
        self.cells[quantity as usize].map_or(f64::NAN, |(value, _)| value)
    }
}

/// A column that is filled.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ResultColumn {
    pub(super) quantity: Quantity,
    /// Number of the column in the file, from 1.
    number: usize,
    /// Half a unit of the last digit printed, the finest in the column: short numbers may be exact.
    pub(super) rounding: f64,
}

fn step_row(row: &Row<'_>) -> Result<StepRow, Box<TableError>> {
    let number = |column| match row.text(column)? {
        "" => Ok(None),
        text => match parse(text) {
            Some(value) => Ok(Some((value, half_last_digit(text)))),
            None => Err(row.refuse_cell(column, text, "not a number")),
        },
    };
    let Some((step, _)) = number(0)? else { return Err(row.refuse_empty(0)) };
    if step <= 0.0 {
        return Err(row.refuse_cell(0, row.text(0)?, "not a time above zero, in seconds"));
    }
    let mut cells = [None; Quantity::ALL.len()];
    for (cell, quantity) in cells.iter_mut().zip(Quantity::ALL) {
        *cell = number(column_of(quantity))?;
    }
    Ok(StepRow { line: row.at().number(), step, cells })
}

impl Table {
    /// Reads a CSV table; `file` is its name in messages.
    ///
    /// A byte order mark, CRLF, quotes, blanks around cells, blank lines and lines that start with `#` are allowed.
    ///
    /// # Errors
    /// [`AuditError`] with the place: every cell must be a number (`nan` and `inf` are read, and fail later), every row
    /// complete, every name known and there once, every step positive, with one value, and four of them different; of
    /// [`ROWS_MAX`] rows at most.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, AuditError> {
        let (mut count, mut header, mut positions) = (0, At::Table, Vec::new());
        let rows = tables::read(file, bytes, &RESULTS, |row| {
            count += 1;
            if count > ROWS_MAX {
                return Err(TableError::of_row(row.at(), 0, Fault::TooManyRows(ROWS_MAX)));
            }
            if count == 1 {
                header = row.header();
                positions = Quantity::ALL.map(|quantity| (row.position(column_of(quantity)), quantity)).to_vec();
            }
            step_row(row)
        })?;
        positions.sort_by_key(|(number, _)| *number);
        let mut table = Self { file: file.to_owned(), rows, columns: Vec::new(), findings: Vec::new() };
        for (number, quantity) in positions.into_iter().filter(|(number, _)| *number > 0) {
            let filled = table.rows.iter().filter_map(|row| row.cells[quantity as usize]);
            let Some(rounding) = filled.map(|(_, rounding)| rounding).reduce(f64::min) else {
                // A column of a template that was never filled says nothing; a gap in a column that is used hides something.
                table.remark(FindingKind::EmptyColumn, Some(quantity), "the column is empty and left out".to_owned());
                continue;
            };
            if let Some(row) = table.rows.iter().find(|row| row.cells[quantity as usize].is_none()) {
                let fault = Fault::EmptyCell(RESULTS.columns[column_of(quantity)].name);
                return Err(TableError::of_row(At::Line(row.line), number, fault).in_file(file).into());
            }
            table.columns.push(ResultColumn { quantity, number, rounding });
        }
        if table.columns.is_empty() {
            let place = Place { file: file.to_owned(), at: header, column: 0 };
            return Err(TableError::new(place, Fault::NoResults, &RESULTS).into());
        }
        table.put_in_order()?;
        Ok(table)
    }

    fn remark(&mut self, kind: FindingKind, quantity: Option<Quantity>, message: String) {
        self.findings.push(Finding { kind, quantity, message });
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
                let [first, second] = [before, &row].map(|row| row.value(column.quantity));
                // NaN twice is the same cell twice; -0 and 0 are one value.
                if first != second && !(first.is_nan() && second.is_nan()) {
                    let place = Place { file: self.file.clone(), at: At::Line(row.line), column: column.number };
                    let name = RESULTS.columns[column_of(column.quantity)].name;
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
        let found = different.iter().filter(|row| row.step.is_finite()).count();
        if found < STEPS_MIN {
            let place = Place { file: self.file.clone(), ..Place::default() };
            return Err(TableError::new(place, Fault::TooFewSteps { found, needed: STEPS_MIN }, &RESULTS).into());
        }
        self.rows = different;
        Ok(())
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
fn parse(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    if lower.contains("#inf") {
        return Some(f64::INFINITY);
    }
    if lower.contains("#ind") || lower.contains("#qnan") || lower.starts_with("nan(") || lower.starts_with("-nan(") {
        return Some(f64::NAN);
    }
    text.parse().ok()
}

/// Half a unit of the last digit of a decimal number; zero for what has no digits.
fn half_last_digit(text: &str) -> f64 {
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
    fn the_last_digit_printed_bounds_what_a_number_means() {
        for (text, half) in [("1.25", 0.005), ("3", 0.5), ("1.5e-6", 0.05e-6), ("2.50E+02", 0.5), ("nan", 0.0)] {
            assert!((half_last_digit(text) - half).abs() <= 1e-15 * half, "{text}");
        }
    }
}
