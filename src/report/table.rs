//! The numbers of a figure, as CSV.

use std::borrow::Cow;
use std::fmt::Display;
use std::io;

/// A table: names of the columns, and rows of the same length.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    header: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows, from its first line: names of columns with commas between.
    pub fn new(header: &'static str) -> Self {
        Self { header: header.split(',').collect(), rows: Vec::new() }
    }

    /// Adds a row. Numbers are printed so that they read back to the same f64.
    ///
    /// # Panics
    /// If the row is not as long as the header: a mistake of the caller.
    pub fn push<const N: usize>(&mut self, row: [&dyn Display; N]) {
        assert!(N == self.header.len(), "a row of {N} in a table of {} columns", self.header.len());
        self.rows.push(row.iter().map(ToString::to_string).collect());
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// As CSV (RFC 4180, lines ended by LF), quoted where a value needs it, each value through [`cell`].
    ///
    /// # Errors
    /// Only if memory for it cannot be had.
    pub fn to_csv(&self) -> io::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.header)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(|value| cell(value).into_owned()))?;
        }
        writer.into_inner().map_err(csv::IntoInnerError::into_error)
    }
}

/// `text` as a cell that neither a spreadsheet nor a terminal obeys.
///
/// A text that begins like a formula has a `'` put in front, as spreadsheets have it; a number keeps its sign. Control
/// characters but the line feed are replaced.
pub fn cell(text: &str) -> Cow<'_, str> {
    let is_formula = text.starts_with(['=', '+', '-', '@']) && text.parse::<f64>().is_err();
    let steers = |c: char| c.is_control() && c != '\n';
    if !is_formula && !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let quote = if is_formula { "'" } else { "" };
    Cow::Owned(format!("{quote}{}", text.replace(steers, "\u{fffd}")))
}

/// A number, or nothing where there is none.
pub fn or_empty(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on should stop")]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_no_formula_and_steers_no_terminal() {
        for (text, expected) in [
            ("=1+1", "'=1+1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("+cmd", "'+cmd"),
            ("-1.5e-3", "-1.5e-3"),
            ("plain = fine", "plain = fine"),
            ("\u{1b}[31mred", "\u{fffd}[31mred"),
            ("=\t1", "'=\u{fffd}1"),
            ("two\nlines", "two\nlines"),
        ] {
            assert_eq!(cell(text), expected);
        }
    }

    #[test]
    fn values_are_quoted_where_they_need_it_and_numbers_read_back() {
        let mut table = Table::new("name,value");
        table.push([&"a,\"b\"\nc", &0.1_f64]);
        table.push([&"plain", &1e-300_f64]);
        let text = String::from_utf8(table.to_csv().unwrap()).unwrap();
        assert!(text.starts_with("name,value\n\"a,\"\"b\"\"\nc\",0.1\nplain,0.000"), "{text}");
        assert_eq!(text.lines().last().unwrap().split_once(',').unwrap().1.parse::<f64>().unwrap(), 1e-300);
    }
}
