//! What is wrong with a file, where in it, what is allowed there and what to do: for scenes, suites and their words.
//!
//! A [`Dialect`] holds the words of one kind of TOML file.

use std::path::Path;

use ariadne::{Config, IndexType, Label, Report, ReportKind, Source};
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::input::{self, Unread};
use crate::text::{clipped, steers};
pub(crate) use crate::text::{did_you_mean, nearest};

/// Largest scene file that is read, 1 MiB. A scene takes about one KiB; more is a mistaken path.
pub const SIZE_MAX: u64 = 1 << 20;

/// Longest line that is shown in an error whole, in characters.
const LINE_WIDTH_MAX: usize = 240;

/// Longest piece of a file that is quoted within a message, in characters.
const QUOTE_LENGTH_MAX: usize = 60;

/// Bytes of a text.
pub(super) type Span = std::ops::Range<usize>;

/// Where in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Bytes of the offending text, counted behind a byte order mark.
    pub span: Span,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// Why a file is refused: what is wrong where, what is allowed, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}: {message}", self.location())]
pub struct SceneError {
    /// File name as given; `standard input` for `-`.
    pub file: String,
    /// Where; `None` if the file could not be read at all.
    pub place: Option<Place>,
    /// What is wrong.
    pub message: String,
    /// What is allowed.
    pub allowed: String,
    /// What to do.
    pub help: String,
    /// The text of the file.
    text: String,
}

impl SceneError {
    /// `file:line:column`, or the file alone if it could not be read.
    pub fn location(&self) -> String {
        let file = printable(&self.file);
        match &self.place {
            Some(place) => format!("{file}:{}:{}", place.line, place.column),
            None => file,
        }
    }

    /// The error for a terminal, the offending text underlined, with colours if `color`.
    ///
    /// Control characters of the file are replaced, so that no file steers the terminal that shows it.
    pub fn render(&self, color: bool) -> String {
        self.underlined(color).unwrap_or_else(|| {
            format!(
                "Error: {}\n  at {}\n  allowed: {}\n  Help: {}\n",
                self.message,
                self.location(),
                self.allowed,
                self.help
            )
        })
    }

    fn underlined(&self, color: bool) -> Option<String> {
        let place = self.place.as_ref()?;
        let text = printable(&self.text);
        let start = place.span.start.min(text.len());
        let line_start = text[..start].rfind('\n').map_or(0, |end| end + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |end| start + end);
        if text[line_start..line_end].chars().count() > LINE_WIDTH_MAX {
            return None;
        }
        let file = printable(&self.file);
        // A span over several lines (an inline table) is underlined in its first.
        let span = (file.as_str(), start..place.span.end.clamp(start, line_end));
        let mut output = Vec::new();
        Report::build(ReportKind::Error, span.clone())
            .with_config(Config::default().with_color(color).with_index_type(IndexType::Byte))
            .with_message(&self.message)
            .with_label(Label::new(span).with_message(&self.allowed).with_color(ariadne::Color::Red))
            .with_help(&self.help)
            .finish()
            .write((file.as_str(), Source::from(text.as_str())), &mut output)
            .ok()?;
        let shown = String::from_utf8(output).ok()?;
        // Nothing stands behind the last visible character of a line.
        Some(shown.lines().flat_map(|line| [line.trim_end(), "\n"]).collect())
    }
}

/// `text` with every character that steers a terminal or breaks a line replaced by one of the same length in bytes.
pub(super) fn printable(text: &str) -> String {
    let replace = |(index, symbol): (usize, char)| match symbol {
        '\n' | '\t' => symbol,
        '\r' if text[index + 1..].starts_with('\n') => symbol,
        _ if steers(symbol) => ['?', '¿', char::REPLACEMENT_CHARACTER][symbol.len_utf8().min(3) - 1],
        _ => symbol,
    };
    text.char_indices().map(replace).collect()
}

/// A piece of the file within a message: one line, bounded, in backticks.
pub(crate) fn quoted(text: &str) -> String {
    format!("`{}`", clipped(&printable(text).replace(['\n', '\r', '\t'], " "), QUOTE_LENGTH_MAX))
}

/// What is wrong with a text, before it is known which file it is from.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(super) span: Span,
    message: String,
    allowed: String,
    help: String,
    /// The error as a whole, where it stands in another file.
    placed: Option<Box<SceneError>>,
}

impl Fault {
    /// Refuses the bytes `span`: what is wrong, what is allowed, what to do.
    pub(crate) fn new(
        span: Span,
        message: impl Into<String>,
        allowed: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self { span, message: message.into(), allowed: allowed.into(), help: help.into(), placed: None }
    }

    /// `error`, which stands in another file.
    pub(super) fn elsewhere(error: Box<SceneError>) -> Self {
        Self { placed: Some(error), ..Self::new(0..0, "", "", "") }
    }

    /// The same in the table `file` that the scene names, whose content is `text`.
    pub(super) fn in_table(self, file: &str, text: &str) -> Self {
        Self::elsewhere(self.in_file(file, text))
    }

    /// The same in `file`, whose content is `text`, unless it stands in another file.
    pub(crate) fn in_file(self, file: &str, text: &str) -> Box<SceneError> {
        if let Some(error) = self.placed {
            return error;
        }
        let mut start = self.span.start.min(text.len());
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        let line_start = text[..start].rfind('\n').map_or(0, |end| end + 1);
        Box::new(SceneError {
            file: file.to_owned(),
            place: Some(Place {
                line: 1 + text[..start].matches('\n').count(),
                column: 1 + text[line_start..start].chars().count(),
                span: start..self.span.end.clamp(start, text.len()),
            }),
            message: self.message,
            allowed: self.allowed,
            help: self.help,
            text: text.to_owned(),
        })
    }
}

/// Name and text of the small UTF-8 file at `path`, without its byte order mark; `-` is standard input.
///
/// # Errors
/// [`SceneError`]: the file cannot be read, is larger than [`SIZE_MAX`], or is not UTF-8.
pub fn read_text(path: &Path) -> Result<(String, String), Box<SceneError>> {
    let file = input::name_of(path);
    let bytes = input::read(path, SIZE_MAX).map_err(|cause| {
        let refuse = |message: &str, allowed: &str, help: &str| Fault::new(0..0, message, allowed, help);
        let fault = match cause {
            Unread::Folder => refuse("this is a directory", "a file, or `-` for standard input", "name a file in it"),
            Unread::TooLarge => {
                let message = "the file is larger than 1 MiB, and was not read";
                refuse(message, "a file of at most 1 MiB", "check that this is the file you mean")
            }
            Unread::System(error) => {
                let message = format!("the file cannot be read: {error}");
                refuse(&message, "a readable file, or `-` for standard input", "check the path")
            }
        };
        Box::new(SceneError { place: None, ..*fault.in_file(&file, "") })
    })?;
    text_of(bytes, &file).map(|text| (file, text))
}

/// `bytes` as UTF-8, without a byte order mark.
pub(super) fn text_of(mut bytes: Vec<u8>, file: &str) -> Result<String, Box<SceneError>> {
    if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes.drain(..3);
    }
    String::from_utf8(bytes).map_err(|error| {
        let start = error.utf8_error().valid_up_to();
        let byte = error.as_bytes()[start];
        // The first replacement character stands where the first bad byte was; what is before it has not moved.
        let text = String::from_utf8_lossy(error.as_bytes());
        Fault::new(
            start..start + char::REPLACEMENT_CHARACTER.len_utf8(),
            format!("the byte 0x{byte:02x} is not UTF-8"),
            "UTF-8 text",
            "save the file in UTF-8",
        )
        .in_file(file, &text)
    })
}

/// What differs between the kinds of TOML files: the words of their errors.
pub(crate) struct Dialect {
    /// The whole file: `the scene`.
    pub(crate) root: &'static str,
    /// Name in messages of the table at a path without its indices: `[projectile]`.
    pub(crate) table: fn(path: &str) -> String,
    /// How to write the value at a path.
    pub(crate) remedy: fn(path: &str) -> String,
    /// What to do at a path about an unknown word that resembles no known one.
    pub(crate) unknown: fn(path: &str, word: &str) -> String,
}

impl Dialect {
    pub(super) fn name_of(&self, path: &str) -> String {
        if path.is_empty() { self.root.to_owned() } else { (self.table)(path) }
    }

    /// Refuses the `word` at `path`, which is none of the `known` ones.
    fn unknown(&self, what: &str, path: &str, place: &str, span: Span, word: &str, known: &[&str]) -> Fault {
        /// Longest list of words in one line (bytes).
        const KNOWN_MAX: usize = 160;
        let help = nearest(word, known).map_or_else(|| (self.unknown)(path, word), did_you_mean);
        let mut known = known.join(", ");
        if known.len() > KNOWN_MAX {
            "those that docs/reference.md lists".clone_into(&mut known);
        }
        let message = format!("unknown {what} {} in {place}", quoted(word));
        Fault::new(span, message, format!("known {what}s: {known}"), help)
    }

    /// Refuses the key `word` of the table at `path`, which has the `known` keys.
    pub(super) fn unknown_key(&self, path: &str, span: Span, word: &str, known: &[&str]) -> Fault {
        self.unknown("key", path, &self.name_of(path), span, word, known)
    }

    /// Refuses the value `word` at `path`, which may have the `known` values.
    pub(super) fn unknown_word(&self, path: &str, span: Span, word: &str, known: &[&str]) -> Fault {
        self.unknown("word", path, &format!("`{}`", key_of(path)), span, word, known)
    }

    /// Refuses the value at `path`, which is `found` and must be `wanted`.
    pub(super) fn mistyped(&self, path: &str, span: Span, found: &str, wanted: &str) -> Fault {
        let message = format!("`{}` is {found}", key_of(path));
        Fault::new(span, message, format!("must be {wanted}"), (self.remedy)(path))
    }

    /// Refuses `table` for the lack of `key`, of which `example` is one.
    pub(crate) fn missing(&self, table: &str, span: Span, key: &str, help: String) -> Fault {
        Fault::new(span, format!("{} has no `{key}`", self.name_of(table)), format!("`{key}` is required here"), help)
    }
}

/// The tables that the TOML `text` describes.
pub(super) fn parse(text: &str) -> Result<Spanned<DeTable<'_>>, Fault> {
    DeTable::parse(text).map_err(|error| not_toml(text, &error))
}

/// Last word of a path.
pub(super) fn key_of(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

/// Type of `value`, with its article.
pub(super) fn type_of(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a truth value",
        DeValue::Datetime(_) => "a date or time",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

fn not_toml(text: &str, error: &toml::de::Error) -> Fault {
    let span = error.span().unwrap_or(0..0);
    // At most the rest of the line: some spans reach to the end of the file.
    let line_end = text.get(span.start..).and_then(|rest| rest.find('\n')).map_or(text.len(), |end| span.start + end);
    let span = span.start..span.end.clamp(span.start, line_end.max(span.start));
    let named = text.get(span.clone()).unwrap_or_default();
    if error.message() == "duplicate key" {
        let message = format!("{} is given twice", quoted(named));
        return Fault::new(span, message, "each key and table once", "remove one of the two");
    }
    let message = printable(error.message());
    let help = if message.contains("recurs") {
        "nest less deep: three levels are enough"
    } else if message.contains("carriage return") {
        "end the lines as Unix or Windows does"
    } else {
        "correct the syntax; strings need quotes"
    };
    Fault::new(span, format!("this is not TOML: {message}"), "TOML text", help)
}
