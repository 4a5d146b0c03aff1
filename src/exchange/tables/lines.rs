//! In which line of a text does a record stand, as an editor counts?
//!
//! A CSV reader counts `\n` alone and skips blank lines, so after CRLF or a blank line its count lags behind the
//! editor's. Behind [`LineEnds`] every line ends with one `\n`. A record without a line break inside then ends one line
//! before the reader's position: [`line_of`].

use std::io::{self, Read, Take};

use ::csv::Reader;

/// A reader that gives each line end, `\n`, `\r\n` or `\r`, as one `\n`, and one to a last line that has none.
#[derive(Debug)]
pub struct LineEnds<R> {
    inner: Take<R>,
    /// The byte given last was a `\n` made of a `\r`: a `\n` behind it belongs to it.
    after_return: bool,
    /// The byte given last, a line end at the start.
    last: u8,
}

impl<R: Read> LineEnds<R> {
    /// Reads from `inner`.
    pub fn new(inner: R) -> Self {
        Self { inner: inner.take(u64::MAX), after_return: false, last: b'\n' }
    }

    /// Lets `most` more bytes be read.
    pub(super) fn allow(&mut self, most: u64) {
        // One more: what uses up all of them is longer.
        self.inner.set_limit(most + 1);
    }

    /// Whether more was read than allowed.
    pub(super) fn is_spent(&self) -> bool {
        self.inner.limit() == 0
    }
}

impl<R: Read> Read for LineEnds<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        // Again only where all that was read was the second half of a line end.
        loop {
            let count = self.inner.read(buffer)?;
            if count == 0 {
                let unfinished = self.last != b'\n';
                if unfinished {
                    self.last = b'\n';
                    buffer[0] = b'\n';
                }
                return Ok(usize::from(unfinished));
            }
            let left = if self.after_return || buffer[..count].contains(&b'\r') {
                self.unify(&mut buffer[..count])
            } else {
                count
            };
            if left > 0 {
                self.last = buffer[left - 1];
                return Ok(left);
            }
        }
    }
}

impl<R> LineEnds<R> {
    /// Unifies the line ends of `bytes` in place; returns how many bytes are left.
    fn unify(&mut self, bytes: &mut [u8]) -> usize {
        let mut left = 0;
        for index in 0..bytes.len() {
            let byte = bytes[index];
            let is_second_half = byte == b'\n' && self.after_return;
            self.after_return = byte == b'\r';
            if !is_second_half {
                bytes[left] = if byte == b'\r' { b'\n' } else { byte };
                left += 1;
            }
        }
        left
    }
}

/// Line, from 1, where the record begins that `reader` has just read from [`LineEnds`]; `cells` are its bytes.
pub fn line_of<R: Read>(reader: &Reader<R>, cells: &[u8]) -> u64 {
    let breaks = cells.split(|byte| *byte == b'\n').count() as u64 - 1;
    // A quote that is open to the end of the file swallows the last line end, and none is left behind the record.
    let is_cut_short = cells.ends_with(b"\n");
    reader.position().line().saturating_sub(breaks + u64::from(!is_cut_short)).max(1)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    /// Gives one byte a call: every line end is torn apart.
    struct OneByOne<'a>(&'a [u8]);

    impl Read for OneByOne<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.0.read(&mut buffer[..1])
        }
    }

    #[test]
    fn every_line_end_is_one_and_the_last_line_has_one() {
        for (text, expected) in [
            ("", ""),
            ("a", "a\n"),
            ("a\nb\n", "a\nb\n"),
            ("a\r\nb\r\n", "a\nb\n"),
            ("a\rb\r", "a\nb\n"),
            ("a\r\n\r\nb", "a\n\nb\n"),
            ("a\n\rb", "a\n\nb\n"),
            ("\r\r\n\n", "\n\n\n"),
        ] {
            let mut whole = String::new();
            LineEnds::new(text.as_bytes()).read_to_string(&mut whole).unwrap();
            assert_eq!(whole, expected, "{text:?}");
            let mut torn = String::new();
            LineEnds::new(OneByOne(text.as_bytes())).read_to_string(&mut torn).unwrap();
            assert_eq!(torn, expected, "{text:?} byte by byte");
        }
    }

    #[test]
    fn a_record_stands_in_the_line_that_an_editor_shows() {
        for ends in ["\n", "\r\n", "\r"] {
            for (text, expected) in [
                ("a|b|c", &[1, 2, 3][..]),
                ("a|b|c|", &[1, 2, 3]),
                ("||a||b|", &[3, 5]),
                ("a|\"b\"|\"c|d\"|e", &[1, 2, 3, 5]),
                ("a|\"b|c", &[1, 2]),
                ("a||b|\"c", &[1, 3, 4]),
            ] {
                let text = text.replace('|', ends);
                let mut reader = ::csv::ReaderBuilder::new()
                    .has_headers(false)
                    .flexible(true)
                    .from_reader(LineEnds::new(text.as_bytes()));
                let mut record = ::csv::ByteRecord::new();
                let mut lines = Vec::new();
                while reader.read_byte_record(&mut record).unwrap() {
                    lines.push(line_of(&reader, record.as_slice()));
                }
                assert_eq!(lines, expected, "{text:?}");
            }
        }
    }
}
