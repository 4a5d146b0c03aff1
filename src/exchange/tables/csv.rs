//! Rows of a CSV table, some thousands at a time.

use std::io::Read;
use std::sync::Arc;

use ::csv::{ByteRecord, Reader, ReaderBuilder};

use super::error::{At, Fault, Place, TableError};
use super::lines::{LineEnds, line_of};
use super::{Data, Format, Layout, Others, Rows};

/// Longest line (bytes): without a limit one open quote, or a file that is no table, would fill the memory.
const LINE_MAX: u64 = 1 << 20;

/// A CSV table that is being read.
pub struct CsvTable<R> {
    file: String,
    reader: Reader<LineEnds<R>>,
    layout: Arc<Layout>,
    format: &'static Format,
}

impl<R: Read> CsvTable<R> {
    /// Reads the first line of `input`; `file` is its name in messages.
    ///
    /// # Errors
    /// [`TableError`] for a first line that does not name the columns of `format`.
    pub fn new(file: &str, input: R, format: &'static Format) -> Result<Self, Box<TableError>> {
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(format.has_comments.then_some(b'#'))
            .buffer_capacity(1 << 16)
            .from_reader(LineEnds::new(input));
        let mut header = ByteRecord::new();
        let refuse = |at, column, fault| TableError::new(Place { file: file.to_owned(), at, column }, fault, format);
        if !read_record(&mut reader, &mut header, file, format)? {
            return Err(refuse(At::Table, 0, Fault::Empty));
        }
        let at = At::Line(line_of(&reader, header.as_slice()));
        if header.as_slice().contains(&b'\n') {
            return Err(refuse(at, 0, Fault::OpenQuote));
        }
        let text_of = |(index, name)| {
            let name = std::str::from_utf8(name).ok().filter(|name| !name.contains('\0'));
            name.ok_or_else(|| refuse(at, index + 1, Fault::NotText))
        };
        let names = header.iter().enumerate().map(text_of).collect::<Result<Vec<_>, _>>()?;
        let layout = Arc::new(Layout::new(&names, file, at, format)?);
        Ok(Self { file: file.to_owned(), reader, layout, format })
    }

    /// The layout that its first line describes.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// At most `count` rows, none at the end; `used` is an earlier chunk whose memory is reused.
    ///
    /// # Errors
    /// [`TableError`] for a table that cannot be read on.
    pub fn next_rows(&mut self, count: usize, used: Option<Rows>) -> Result<Rows, Box<TableError>> {
        let (mut records, mut lines) = match used.map(|used| used.data) {
            Some(Data::Csv(records, lines)) => (records, lines),
            _ => Default::default(),
        };
        lines.clear();
        while lines.len() < count {
            let index = lines.len();
            if records.len() == index {
                records.push(ByteRecord::new());
            }
            let record = &mut records[index];
            if !read_record(&mut self.reader, record, &self.file, self.format)? {
                break;
            }
            let has_break = record.as_slice().contains(&b'\n');
            let line = line_of(&self.reader, if has_break { record.as_slice() } else { b"" });
            // A text that is ignored may have several lines.
            if has_break && !(self.format.others == Others::Ignored && record.len() == self.layout.names.len()) {
                let place = Place { file: self.file.clone(), at: At::Line(line), column: 0 };
                return Err(TableError::new(place, Fault::OpenQuote, self.format));
            }
            lines.push(line);
        }
        Ok(Rows { layout: Arc::clone(&self.layout), count: lines.len(), data: Data::Csv(records, lines) })
    }
}

/// Reads the next record of `reader`; false at the end. The record may have [`LINE_MAX`] bytes.
fn read_record<R: Read>(
    reader: &mut Reader<LineEnds<R>>,
    record: &mut ByteRecord,
    file: &str,
    format: &Format,
) -> Result<bool, Box<TableError>> {
    let at = At::Line(reader.position().line());
    reader.get_mut().allow(LINE_MAX);
    let (at, fault) = match reader.read_byte_record(record) {
        _ if reader.get_ref().is_spent() => (at, Fault::LineTooLong),
        Ok(is_read) => return Ok(is_read),
        Err(error) => (At::Table, Fault::Unreadable(error.to_string())),
    };
    Err(TableError::new(Place { file: file.to_owned(), at, column: 0 }, fault, format))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::super::{Column, Need, Row};
    use super::*;

    static FORMAT: Format = Format {
        columns: &[Column::number("a"), Column::number("b").needed(Need::Default(7.0)), Column::text("c")],
        others: Others::Refused,
        has_comments: false,
    };

    /// The rows of `table`, read in chunks of two whose memory is reused.
    fn rows(table: impl AsRef<[u8]>) -> Vec<Result<(f64, f64, String), String>> {
        let mut table = CsvTable::new("t.csv", table.as_ref(), &FORMAT).unwrap();
        let (mut all, mut used) = (Vec::new(), None);
        loop {
            let records = table.next_rows(2, used.take()).unwrap();
            if records.is_empty() {
                return all;
            }
            let cells = |row: Row<'_>| Ok((row.number(0)?, row.number(1)?, row.text(2)?.to_owned()));
            let row = |index| records.row(index).and_then(cells).map_err(|error| error.to_string());
            all.extend((0..records.len()).map(row));
            used = Some(records);
        }
    }

    #[test]
    fn a_byte_order_mark_windows_lines_quotes_blanks_and_no_last_newline_change_nothing() {
        for table in
            ["a,b,c\n3,,x\n", "\u{feff}a,b,c\r\n3,7,x\r\n", "a,b,c\n\"3\",\"\",\"x\"", " a, b ,c\n\n 3 , 7, x\n\n"]
        {
            assert_eq!(rows(table), [Ok((3.0, 7.0, "x".to_owned()))], "{table}");
        }
    }

    #[test]
    fn a_bad_row_names_the_line_that_an_editor_shows_and_stops_nothing() {
        for ends in ["\n", "\r\n", "\r"] {
            let all = rows("a,b,c|1,2,x|||two,2,x||1,2,x|2".replace('|', ends));
            assert_eq!(all[1], Err("line 5, column 1: `two` in `a` is not a number".to_owned()));
            assert_eq!(all[3], Err("line 8: 1 cell in a table of 3 columns".to_owned()));
            assert_eq!(all[0], all[2]);
        }
        assert_eq!(rows(b"a,b,c\n1,2,\xff\n"), [Err("line 2, column 3: not text in UTF-8".to_owned())]);
    }
}
