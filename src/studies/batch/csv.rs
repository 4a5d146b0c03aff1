//! Scenes from a CSV table, some thousand rows at a time.
//!
//! A row that is no scene is a row with a message, and the others go on. A table is refused as a whole only where no
//! row could be trusted: a first line that names no columns, or a quote that swallows the lines behind it.

use std::cell::Cell;
use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use csv::{ByteRecord, Reader, ReaderBuilder};

use super::super::table_text::{LineEnds, counted, line_of, shortened};
use super::{COLUMNS, CRITERION, Layout, NUMBERS, Row, TableError};
use crate::physics::Scene;
use crate::physics::units::{QuantityError, number};
use crate::studies::audit::Place;

/// Longest line [bytes]: without a limit one open quote, or a file that is no table, would fill the memory.
const LINE_MAX: u64 = 1 << 20;

/// Records of a table, with the layout to read them by.
#[derive(Debug)]
pub struct Records {
    layout: Arc<Layout>,
    #[expect(clippy::struct_field_names, reason = "the records are what the type is of")]
    records: Vec<ByteRecord>,
    /// Line of each.
    lines: Vec<u64>,
    /// Records in use; the others wait to be filled again.
    count: usize,
}

impl Records {
    /// How many.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Line of record `index`, from 1.
    pub fn line(&self, index: usize) -> u64 {
        self.lines[index]
    }

    /// The scene of record `index`, from 0.
    ///
    /// # Errors
    /// What is wrong, with the column.
    pub fn scene(&self, index: usize) -> Result<Scene, String> {
        let record = &self.records[index];
        if record.len() != self.layout.width {
            let (found, expected) = (record.len() as u64, self.layout.width as u64);
            return Err(format!("{} in a table of {}", counted(found, "cell"), counted(expected, "column")));
        }
        let cell = |index: usize| -> Result<&str, String> {
            let Some(place) = self.layout.places[index] else { return Ok("") };
            std::str::from_utf8(record.get(place).unwrap_or_default())
                .map(str::trim)
                .map_err(|_| format!("{}: not UTF-8 text", COLUMNS[index]))
        };
        let mut row = Row::default();
        #[expect(clippy::needless_range_loop, reason = "one index for the cell, its name and its place in the row")]
        for index in 0..NUMBERS {
            let text = cell(index)?;
            if !text.is_empty() {
                let value = number(text).map_err(|error| {
                    let what = match error {
                        QuantityError::NotFinite => "not finite",
                        QuantityError::TooSmall => "too small for 64 bits",
                        _ => "not a number",
                    };
                    format!("{}: `{}` is {what}", COLUMNS[index], shortened(text))
                })?;
                row.numbers[index] = Some(value);
            }
        }
        row.criterion = Some(cell(CRITERION)?);
        row.scene()
    }
}

/// What a limited reader says when a line is too long.
const TOO_LONG: &str = "line longer than 1 MiB";

/// Bytes that may still be read for the line at hand.
#[derive(Clone, Debug)]
struct Allowance(Arc<AtomicU64>);

/// A reader that stops when a line outgrows its allowance.
struct Limited<R> {
    inner: R,
    allowance: Allowance,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.allowance.0.load(Ordering::Relaxed);
        if left == 0 {
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, TOO_LONG));
        }
        let room = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        let count = self.inner.read(&mut buffer[..room])?;
        self.allowance.0.store(left - count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

/// A CSV table of scenes that is being read.
pub struct CsvScenes<R> {
    file: String,
    reader: Reader<LineEnds<Limited<R>>>,
    allowance: Allowance,
    layout: Arc<Layout>,
}

impl<R: Read> CsvScenes<R> {
    /// Reads the first line of `input`; `file` is its name in messages.
    ///
    /// # Errors
    /// [`TableError`] for a first line that does not name the columns.
    pub fn new(file: &str, input: R) -> Result<Self, TableError> {
        let allowance = Allowance(Arc::new(AtomicU64::new(LINE_MAX)));
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .buffer_capacity(1 << 16)
            .from_reader(LineEnds::new(Limited { inner: input, allowance: allowance.clone() }));
        let mut header = ByteRecord::new();
        let place = |line| move |column| Place { file: file.to_owned(), line, column };
        let found = reader.read_byte_record(&mut header).map_err(|error| refusal(file, 1, &error))?;
        if !found {
            return Err(TableError::Empty { file: file.to_owned() });
        }
        let line = line_of(&reader, header.as_slice());
        if header.iter().any(|name| name.contains(&b'\n')) {
            return Err(TableError::OpenQuote { place: place(line)(0) });
        }
        let mut names = Vec::with_capacity(header.len());
        for (index, name) in header.iter().enumerate() {
            let name = std::str::from_utf8(name).ok().filter(|name| !name.contains('\0'));
            names.push(name.ok_or_else(|| TableError::NotText { place: place(line)(index + 1) })?);
        }
        let layout = Arc::new(Layout::new(names, place(line))?);
        Ok(Self { file: file.to_owned(), reader, allowance, layout })
    }

    /// At most `count` rows, none at the end; `used` is an earlier chunk whose memory serves again.
    ///
    /// # Errors
    /// [`TableError`] for a table that cannot be read on.
    pub fn next_rows(&mut self, count: usize, used: Option<Records>) -> Result<Records, TableError> {
        let (mut records, mut lines) = used.map_or_else(Default::default, |used| (used.records, used.lines));
        lines.clear();
        let filled = Cell::new(0);
        while filled.get() < count {
            let index = filled.get();
            if records.len() == index {
                records.push(ByteRecord::new());
            }
            let record = &mut records[index];
            self.allowance.0.store(LINE_MAX, Ordering::Relaxed);
            let line = self.reader.position().line();
            if !self.reader.read_byte_record(record).map_err(|error| refusal(&self.file, line, &error))? {
                break;
            }
            if record.as_slice().contains(&b'\n') {
                let line = line_of(&self.reader, record.as_slice());
                return Err(TableError::OpenQuote { place: Place { file: self.file.clone(), line, column: 0 } });
            }
            lines.push(line_of(&self.reader, b""));
            filled.set(index + 1);
        }
        Ok(Records { layout: Arc::clone(&self.layout), records, lines, count: filled.get() })
    }
}

/// A reader's error as a refusal of the table.
fn refusal(file: &str, line: u64, error: &csv::Error) -> TableError {
    match error.kind() {
        csv::ErrorKind::Io(cause) if cause.kind() == io::ErrorKind::FileTooLarge => {
            TableError::LineTooLong { place: Place { file: file.to_owned(), line, column: 0 } }
        }
        csv::ErrorKind::Io(cause) => TableError::Unreadable { file: file.to_owned(), cause: cause.to_string() },
        _ => TableError::Unreadable { file: file.to_owned(), cause: error.to_string() },
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    const HEADER: &str = "velocity_m_s,mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,S";

    fn rows(table: impl AsRef<[u8]>) -> Result<Vec<Result<Scene, String>>, TableError> {
        let mut scenes = CsvScenes::new("t.csv", table.as_ref())?;
        let (mut all, mut used) = (Vec::new(), None);
        loop {
            let records = scenes.next_rows(2, used.take())?;
            if records.is_empty() {
                return Ok(all);
            }
            let placed = |index| records.scene(index).map_err(|cause| format!("line {}: {cause}", records.line(index)));
            all.extend((0..records.len()).map(placed));
            used = Some(records);
        }
    }

    #[test]
    fn a_byte_order_mark_windows_lines_quotes_blanks_and_no_last_newline_change_nothing() {
        let plain = rows(format!("{HEADER}\n300,2,0.05,0.72,36e6,2300,\n")).unwrap();
        assert_eq!(plain[0].as_ref().unwrap().velocity, Some(300.0));
        for table in [
            format!("\u{feff}{HEADER}\r\n300,2,0.05,0.72,36e6,2300,\r\n"),
            format!("{HEADER}\n\"300\",\"2\",\"0.05\",0.72,36e6,2300,\"\""),
            format!("{}\n\n 300 , 2,0.05,0.72 ,36e6,2300, \n\n", HEADER.replace(',', " , ")),
        ] {
            assert_eq!(rows(&table).unwrap(), plain, "{table}");
        }
    }

    #[test]
    fn a_bad_row_names_the_line_that_an_editor_shows() {
        let good = "300,2,0.05,0.72,36e6,2300,";
        for ends in ["\n", "\r\n", "\r"] {
            let table = format!("{HEADER}|{good}|||two{good}||{good}|2").replace('|', ends);
            let all = rows(table).unwrap();
            assert!(all[1].as_ref().unwrap_err().starts_with("line 5: velocity_m_s: `two300`"), "{:?}", all[1]);
            assert!(all[3].as_ref().unwrap_err().starts_with("line 8: 1 cell in"), "{:?}", all[3]);
        }
    }

    #[test]
    fn a_bad_row_names_its_line_and_column_and_stops_nothing() {
        let good = "300,2,0.05,0.72,36e6,2300,";
        for (row, expected) in [
            ("300,2,0.05,0.72,36e6,2300", "line 3: 6 cells in a table of 7 columns"),
            ("300,two,0.05,0.72,36e6,2300,", "line 3: mass_kg: `two` is not a number"),
            ("nan,2,0.05,0.72,36e6,2300,", "line 3: velocity_m_s: `nan` is not finite"),
            ("1e999,2,0.05,0.72,36e6,2300,", "line 3: velocity_m_s: `1e999` is not finite"),
            (",2,0.05,0.72,36e6,2300,", "line 3: velocity_m_s: empty, and every scene needs it"),
            // S would follow from the strength: no scene with a NaN.
            (
                "300,2,0.05,0.72,-36e6,2300,",
                "line 3: the strength fc [Pa] = -36000000 is not admissible: it must be a number > 0",
            ),
            ("300,2,0.05,0.72,0,2300,", "line 3: the strength fc [Pa] = 0 is not admissible: it must be a number > 0"),
        ] {
            let all = rows(format!("{HEADER}\n{good}\n{row}\n{good}\n{good}\n")).unwrap();
            assert_eq!(all.len(), 4);
            assert_eq!(all[1].as_ref().unwrap_err(), expected);
            assert!([0, 2, 3].iter().all(|i| all[*i].is_ok()));
        }
        let mut bytes = format!("{HEADER}\n{good}\n").into_bytes();
        bytes.extend_from_slice(b"300,\xff,0.05,0.72,36e6,2300,\n");
        assert_eq!(rows(bytes).unwrap()[1].as_ref().unwrap_err(), "line 3: mass_kg: not UTF-8 text");
    }

    #[test]
    fn a_table_that_no_row_of_can_be_trusted_is_refused_at_its_place() {
        let refusal = |table: &[u8]| rows(table).unwrap_err().to_string();
        assert_eq!(refusal(b""), "t.csv: the table is empty: its first line must name the columns");
        assert_eq!(refusal(b"\xff\xfem\0a\0"), "t.csv:1, column 1: the first line is not text in UTF-8");
        let open = format!("{HEADER}\n300,\"2,0.05,0.72,36e6,2300,\n300,2,0.05,0.72,36e6,2300,\n");
        assert_eq!(refusal(open.as_bytes()), "t.csv:2: a quote is opened and not closed in this line");
        let endless = format!("{HEADER}\n{}", "9".repeat(3 << 20));
        assert_eq!(
            refusal(endless.as_bytes()),
            "t.csv:2: this line has no end within 1 MiB: it is no table, or a quote is not closed"
        );
    }
}
