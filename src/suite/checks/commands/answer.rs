//! What a run printed, as data: JSON by the paths of its fields, CSV by the names of its columns, numbers of text.

use serde_json::Value;

use crate::suite::Program;
use crate::suite::claim::{Found, NotMeasured};
use crate::suite::program::Said;

/// JSON that a run printed.
#[derive(Debug)]
pub(super) struct Answer {
    line: String,
    pub(super) json: Value,
}

/// A run in a folder of its own: what it said, and the files that it wrote.
pub(super) fn run(program: &Program, line: &str, given: &[(&str, &str)]) -> Found<(Said, Vec<(String, String)>)> {
    let given: Vec<_> = given.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect();
    program.run_apart(line, &given)
}

impl Answer {
    /// What `line` prints with `--json`.
    pub(super) fn of(program: &Program, line: &str, given: &[(&str, &str)]) -> Found<Self> {
        Self::and_files(program, line, given).map(|(answer, _)| answer)
    }

    /// Also the files that it wrote.
    pub(super) fn and_files(
        program: &Program,
        line: &str,
        given: &[(&str, &str)],
    ) -> Found<(Self, Vec<(String, String)>)> {
        let line = format!("{line} --json");
        let (said, files) = run(program, &line, given)?;
        Ok((Self::read(&line, &said)?, files))
    }

    pub(super) fn read(line: &str, said: &Said) -> Found<Self> {
        let json = serde_json::from_str(&said.out)
            .map_err(|_| NotMeasured::broken(format!("`{line}` exits {} {}", said.code, said.err.trim())))?;
        Ok(Self { line: line.to_owned(), json })
    }

    /// What stands at `path`, names and indices joined by dots; `null` where nothing does.
    pub(super) fn at(&self, path: &str) -> &Value {
        self.json.pointer(&format!("/{}", path.replace('.', "/"))).unwrap_or(&Value::Null)
    }

    /// The number at `path`.
    pub(super) fn number(&self, path: &str) -> Found<f64> {
        let missing = || NotMeasured::broken(format!("`{}`: no number `{path}`", self.line));
        self.at(path).as_f64().ok_or_else(missing)
    }

    /// The list at `path`, empty where there is none.
    pub(super) fn list(&self, path: &str) -> &[Value] {
        self.at(path).as_array().map_or(&[], Vec::as_slice)
    }
}

/// The number `name` of an object; NaN where there is none.
pub(super) fn of(object: &Value, name: &str) -> f64 {
    object.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// Relative difference of `value` from `exact`, absolute where that is zero; two that are no numbers do not differ.
pub(super) fn apart(value: f64, exact: f64) -> f64 {
    match (value.is_nan(), exact.is_nan()) {
        (true, true) => 0.0,
        (false, false) if value == exact => 0.0,
        (false, false) if exact == 0.0 => value.abs(),
        (false, false) => (value / exact - 1.0).abs(),
        _ => f64::INFINITY,
    }
}

/// A table in CSV: its columns, and the rows below.
pub(super) struct Table {
    names: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn read(text: &str) -> Found<Self> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let names = reader.headers()?.iter().map(str::to_owned).collect();
        let rows = reader.records().map(|row| Ok(row?.iter().map(str::to_owned).collect()));
        Ok(Self { names, rows: rows.collect::<Found<_>>()? })
    }

    /// The cell of `row` in the column `name`.
    pub(super) fn cell<'a>(&self, row: &'a [String], name: &str) -> Found<&'a str> {
        let place = self.names.iter().position(|other| other == name);
        let cell = place.and_then(|place| row.get(place));
        cell.map(String::as_str).ok_or_else(|| NotMeasured::broken(format!("no column `{name}`")))
    }

    /// The number there; NaN where it is empty.
    pub(super) fn number(&self, row: &[String], name: &str) -> Found<f64> {
        let cell = self.cell(row, name)?;
        if cell.is_empty() { Ok(f64::NAN) } else { Ok(cell.parse()?) }
    }
}

/// The number with the unit behind it, SI: `144.826`, `mm` with the unit `m`.
pub(super) fn with_unit(number: &str, unit: &str, base: &str) -> Option<f64> {
    let exponent = match unit.strip_suffix(base)? {
        "p" => -12,
        "n" => -9,
        "µ" => -6,
        "m" => -3,
        "" => 0,
        "k" => 3,
        "M" => 6,
        "G" => 9,
        "T" => 12,
        _ => return None,
    };
    format!("{number}e{exponent}").parse().ok()
}
