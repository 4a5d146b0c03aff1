//! Which scene a TOML file describes, and where and why a file describes none.
//!
//! Every refusal is a [`SceneError`]: it underlines the offending text and says what is allowed and what to do.
//! Nothing is skipped or guessed: an unknown key is refused, so a misspelt optional one cannot be silently ignored.

use std::fs::File;
use std::io::Read;
use std::ops;
use std::path::Path;

use ariadne::{Config, IndexType, Label, Report, ReportKind, Source};
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::nose::NoseShape;
use super::number::Shown;
use super::scene::{Concrete, CraterStiffness, Criterion, Layer, Range, Resistance, Scene, layer_beyond};
use super::semi_empirical;
use super::stage::Stage;
use super::units::{self, Dimension, QuantityError};

/// The scenes of `verification/scenes`, by file name without its ending: the real input that the suite runs on.
pub const SHIPPED: &[(&str, &str)] = &[
    ("forrestal-1994-shot-14", include_str!("../../verification/scenes/forrestal-1994-shot-14.toml")),
    ("paper-slab", include_str!("../../verification/scenes/paper-slab.toml")),
    ("crater", include_str!("../../verification/scenes/crater.toml")),
    ("tunnel", include_str!("../../verification/scenes/tunnel.toml")),
    ("perforate", include_str!("../../verification/scenes/perforate.toml")),
    ("graze", include_str!("../../verification/scenes/graze.toml")),
    ("stiff", include_str!("../../verification/scenes/stiff.toml")),
    ("viscous", include_str!("../../verification/scenes/viscous.toml")),
    ("layered", include_str!("../../verification/scenes/layered.toml")),
    ("air-gap", include_str!("../../verification/scenes/air-gap.toml")),
    ("tunnel-no-drag", include_str!("../../verification/scenes/tunnel-no-drag.toml")),
    ("perforate-no-drag", include_str!("../../verification/scenes/perforate-no-drag.toml")),
    ("jump", include_str!("../../verification/scenes/jump.toml")),
    ("jump-perforate", include_str!("../../verification/scenes/jump-perforate.toml")),
    ("thin-slab", include_str!("../../verification/scenes/thin-slab.toml")),
    ("layer-at-crater-end", include_str!("../../verification/scenes/layer-at-crater-end.toml")),
    ("loaded-spring", include_str!("../../verification/scenes/loaded-spring.toml")),
    ("spring-and-drag", include_str!("../../verification/scenes/spring-and-drag.toml")),
    ("overdamped", include_str!("../../verification/scenes/overdamped.toml")),
    ("constant-force", include_str!("../../verification/scenes/constant-force.toml")),
];

/// Largest scene file that is read, 1 MiB. A scene takes about one KiB; more is a mistaken path.
pub const SIZE_MAX: u64 = 1 << 20;

/// Longest line that is shown in an error whole, in characters.
const LINE_WIDTH_MAX: usize = 240;

/// Longest piece of a file that is quoted within a message, in characters.
const QUOTE_LENGTH_MAX: usize = 60;

/// Where in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Bytes of the offending text, counted behind a byte order mark.
    pub span: ops::Range<usize>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// Why a file is no scene: what is wrong where, what is allowed, and what to do.
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
    /// Refuses the bytes `span` of `text`, the content of `file`: what is wrong, what is allowed, what to do.
    pub fn at(
        file: &str,
        text: &str,
        span: ops::Range<usize>,
        message: impl Into<String>,
        allowed: impl Into<String>,
        help: impl Into<String>,
    ) -> Box<Self> {
        Fault::new(span, message, allowed, help).in_file(file, text)
    }

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
fn printable(text: &str) -> String {
    let replace = |(index, symbol): (usize, char)| match symbol {
        '\n' | '\t' => symbol,
        '\r' if text[index + 1..].starts_with('\n') => symbol,
        '\u{2028}' | '\u{2029}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
            char::REPLACEMENT_CHARACTER
        }
        _ if symbol.is_control() => {
            if symbol.len_utf8() == 1 {
                '?'
            } else {
                '¿'
            }
        }
        _ => symbol,
    };
    text.char_indices().map(replace).collect()
}

/// A piece of the file within a message: one line, bounded, in backticks.
fn quoted(text: &str) -> String {
    let mut piece: String = printable(text).replace(['\n', '\r', '\t'], " ").chars().take(QUOTE_LENGTH_MAX).collect();
    if text.chars().count() > QUOTE_LENGTH_MAX {
        piece.push('…');
    }
    format!("`{piece}`")
}

/// What is wrong with a text, before it is known which file it is from.
#[derive(Debug)]
struct Fault {
    span: ops::Range<usize>,
    message: String,
    allowed: String,
    help: String,
}

impl Fault {
    fn new(
        span: ops::Range<usize>,
        message: impl Into<String>,
        allowed: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self { span, message: message.into(), allowed: allowed.into(), help: help.into() }
    }

    fn in_file(self, file: &str, text: &str) -> Box<SceneError> {
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

impl Scene {
    /// The scene that the TOML `text` describes; `file` is its name in messages.
    ///
    /// # Errors
    /// [`SceneError`]: the text is not TOML, or not a scene.
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::Scene;
    /// let text = r#"
    ///     [projectile]
    ///     mass = "1 kg"
    ///     [[stage]]
    ///     static_force = "2 kN"
    ///     [impact]
    ///     velocity = 100
    /// "#;
    /// let problem = Scene::from_toml(text, "scene.toml")?.problem()?;
    /// assert_eq!(problem.stages[0].static_force, 2000.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str, file: &str) -> Result<Self, Box<SceneError>> {
        scene(text).map_err(|fault| fault.in_file(file, text))
    }

    /// The scene in the file at `path`; `-` is standard input.
    ///
    /// # Errors
    /// [`SceneError`]: the file cannot be read, is larger than [`SIZE_MAX`] (it is then not read), is not UTF-8, or is
    /// not a scene.
    pub fn read(path: &Path) -> Result<Self, Box<SceneError>> {
        let (file, text) = read_text(path)?;
        Self::from_toml(&text, &file)
    }
}

/// Name and text of the small UTF-8 file at `path`, without its byte order mark; `-` is standard input.
///
/// # Errors
/// [`SceneError`]: the file cannot be read, is larger than [`SIZE_MAX`], or is not UTF-8.
pub fn read_text(path: &Path) -> Result<(String, String), Box<SceneError>> {
    let from_stdin = path.as_os_str() == "-";
    let file = if from_stdin { "standard input".to_owned() } else { path.display().to_string() };
    let unread = |message: String, allowed: &str, help: &str| {
        Box::new(SceneError {
            file: file.clone(),
            place: None,
            message,
            allowed: allowed.to_owned(),
            help: help.to_owned(),
            text: String::new(),
        })
    };
    let unreadable = |error: std::io::Error| {
        unread(
            format!("the file cannot be read: {error}"),
            "a readable file, or `-` for standard input",
            "check the path",
        )
    };
    let too_large = || {
        unread(
            "the file is larger than 1 MiB, and was not read".to_owned(),
            "a file of at most 1 MiB",
            "check that this is the file you mean",
        )
    };
    let bytes = if from_stdin {
        bounded(std::io::stdin().lock())
    } else {
        let metadata = std::fs::metadata(path).map_err(unreadable)?;
        if metadata.is_dir() {
            return Err(unread(
                "this is a directory".to_owned(),
                "a file, or `-` for standard input",
                "name a file in it",
            ));
        }
        if metadata.len() > SIZE_MAX {
            return Err(too_large());
        }
        // A device or a pipe has no length beforehand.
        File::open(path).and_then(bounded)
    }
    .map_err(unreadable)?;
    if bytes.len() as u64 > SIZE_MAX {
        return Err(too_large());
    }
    text_of(bytes, &file).map(|text| (file, text))
}

/// What `source` holds, up to one byte more than is allowed.
fn bounded(source: impl Read) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(SIZE_MAX + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// `bytes` as UTF-8, without a byte order mark.
fn text_of(mut bytes: Vec<u8>, file: &str) -> Result<String, Box<SceneError>> {
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

/// Keys of each table.
const ROOT: &[&str] = &["title", "projectile", "target", "resistance", "impact", "perforation", "stage"];
const PROJECTILE: &[&str] = &["mass", "diameter", "nose"];
const NOSE: &[&str] = &["factor", "shape", "caliber_radius_head", "length_ratio", "radius_ratio"];
const TARGET: &[&str] = &["strength", "density", "thickness", "layer"];
const LAYER: &[&str] = &["thickness", "strength", "density", "S", "viscosity"];
const RESISTANCE: &[&str] = &["S", "B", "k", "crater_stiffness"];
const IMPACT: &[&str] = &["velocity"];
const PERFORATION: &[&str] = &["criterion"];
const STAGE: &[&str] = &["static_force", "stiffness", "viscosity", "drag", "end"];

/// Every table by its header, to tell where a misplaced key belongs.
const TABLES: &[(&str, &[&str])] = &[
    ("[projectile]", PROJECTILE),
    ("the nose", NOSE),
    ("[target]", TARGET),
    ("[[target.layer]]", LAYER),
    ("[resistance]", RESISTANCE),
    ("[impact]", IMPACT),
    ("[perforation]", PERFORATION),
    ("[[stage]]", STAGE),
];

type Value<'i> = Spanned<DeValue<'i>>;

/// A table of the file: its keys are known, their values not yet read.
struct Section<'t, 'i> {
    /// Header for messages: `[projectile]`.
    name: &'static str,
    table: &'t DeTable<'i>,
    /// The header, or the inline table.
    span: ops::Range<usize>,
    /// The file, from which offending text is quoted.
    text: &'t str,
}

impl<'t, 'i> Section<'t, 'i> {
    /// The table, once it has no other than the keys `known`.
    fn new(
        name: &'static str,
        table: &'t DeTable<'i>,
        span: ops::Range<usize>,
        text: &'t str,
        known: &[&'static str],
    ) -> Result<Self, Fault> {
        let unknown = table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(Self { name, table, span, text }),
            Some(key) => Err(unknown_key(name, key, known)),
        }
    }

    fn get(&self, key: &str) -> Option<&'t Value<'i>> {
        self.table.get(key)
    }

    /// Span of `key` itself.
    fn key_span(&self, key: &str) -> ops::Range<usize> {
        self.table.get_key_value(key).map_or_else(|| self.span.clone(), |(key, _)| key.span())
    }

    fn missing(&self, key: &str, example: &str) -> Fault {
        Fault::new(
            self.span.clone(),
            format!("{} has no `{key}`", self.name),
            format!("`{key}` is required here"),
            format!("add {key} = {example}"),
        )
    }

    fn missing_table(&self, header: &str, help: &str) -> Fault {
        Fault::new(
            self.span.clone(),
            format!("{} has no {header}", self.name),
            format!("{header} is required"),
            format!("add {help}"),
        )
    }

    /// Fault of the value of `key`, which is of the wrong type.
    fn wrong_type(key: &str, value: &Value<'_>, wanted: &str, help: &str) -> Fault {
        Fault::new(
            value.span(),
            format!("`{key}` is {}", type_name(value.get_ref())),
            format!("must be {wanted}"),
            help,
        )
    }

    fn table(&self, key: &'static str, name: &'static str, known: &[&'static str]) -> Result<Option<Self>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let DeValue::Table(table) = value.get_ref() else {
            let help =
                if key == "nose" { "write nose = { factor = 0.72 }".to_owned() } else { format!("write {name}") };
            return Err(Self::wrong_type(key, value, "a table", &help));
        };
        Section::new(name, table, self.header_span(key, value), self.text, known).map(Some)
    }

    /// The header or inline table of `key`; the key itself where a table has neither (dotted keys).
    fn header_span(&self, key: &str, value: &Value<'_>) -> ops::Range<usize> {
        if value.span().is_empty() { self.key_span(key) } else { value.span() }
    }

    /// An array of tables, each with keys `known`; `None` when absent, never empty.
    fn tables(
        &self,
        key: &'static str,
        name: &'static str,
        known: &[&'static str],
    ) -> Result<Option<Vec<Self>>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let help = format!("write each as {name}");
        let DeValue::Array(array) = value.get_ref() else {
            let mut fault = Self::wrong_type(key, value, "an array of tables", &help);
            fault.span = self.header_span(key, value);
            return Err(fault);
        };
        if array.is_empty() {
            return Err(Fault::new(value.span(), format!("`{key}` is empty"), "at least one table", help));
        }
        let read = |value: &'t Value<'i>| match value.get_ref() {
            DeValue::Table(table) => Section::new(name, table, value.span(), self.text, known),
            _ => Err(Self::wrong_type(key, value, "a table", &help)),
        };
        array.iter().map(read).collect::<Result<_, _>>().map(Some)
    }

    fn string(&self, key: &str, help: &str) -> Result<Option<(&'t str, ops::Range<usize>)>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some((text.as_ref(), value.span()))),
            _ => Err(Self::wrong_type(key, value, "a string", help)),
        }
    }

    /// A number without unit.
    fn number(&self, key: &str, range: Range) -> Result<Option<f64>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let Some(number) = plain_number(value.get_ref()) else {
            let wanted = format!("{}, without unit or quotes", range.description());
            return Err(Self::wrong_type(
                key,
                value,
                &wanted,
                &format!("write for instance {key} = {}", range.example()),
            ));
        };
        let number = number.map_err(|error| {
            Fault::new(value.span(), format!("`{key}`: {error}"), range.description(), "correct the number")
        })?;
        self.admit(key, value, number, range, &format!("correct `{key}`")).map(Some)
    }

    /// A quantity, `"number unit"` or a bare number in SI units, in SI units.
    fn quantity(&self, key: &str, dimension: Dimension, range: Range) -> Result<Option<f64>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let si = dimension.units()[0];
        let example = format!("\"1 {si}\"");
        let number = match (value.get_ref(), plain_number(value.get_ref())) {
            (DeValue::String(text), _) => units::quantity(text, dimension)
                .map_err(|error| self.bad_quantity(key, value, text, dimension, &error))?,
            (_, Some(number)) => number.map_err(|error| {
                Fault::new(value.span(), format!("`{key}`: {error}"), range.description(), "correct the number")
            })?,
            _ => {
                let wanted = format!("a {}: \"number unit\", or a bare number in {si}", dimension.noun());
                return Err(Self::wrong_type(key, value, &wanted, &format!("write for instance {key} = {example}")));
            }
        };
        self.admit(key, value, number, range, &format!("correct `{key}`; it is read in {si} as {}", Shown(number)))
            .map(Some)
    }

    fn admit(&self, key: &str, value: &Value<'_>, number: f64, range: Range, help: &str) -> Result<f64, Fault> {
        if range.contains(number) {
            return Ok(number);
        }
        let raw = quoted(&format!("{key} = {}", self.text.get(value.span()).unwrap_or_default()));
        Err(Fault::new(value.span(), format!("{raw} is out of range"), range.description(), help))
    }

    fn bad_quantity(
        &self,
        key: &str,
        value: &Value<'_>,
        text: &str,
        dimension: Dimension,
        error: &QuantityError,
    ) -> Fault {
        let known = dimension.units();
        let mut allowed = format!("a {}, in {} and others", dimension.noun(), known.join(", "));
        let (span, message, help) = match error {
            QuantityError::UnknownUnit { unit } => {
                let help = if unit.starts_with(',') {
                    "write a decimal point, and no separators between thousands".to_owned()
                } else if unit.starts_with(|c: char| c.is_ascii_digit()) {
                    "write the number without blanks inside".to_owned()
                } else {
                    nearest(unit, known).map_or_else(|| format!("give it in {}", known[0]), did_you_mean)
                };
                (self.part(value, text, unit), format!("{} is no unit that is known", quoted(unit)), help)
            }
            QuantityError::WrongDimension { unit, has } => (
                self.part(value, text, unit),
                format!("`{key}` takes a {}; {} is a unit of {}", dimension.noun(), quoted(unit), has.noun()),
                format!("give it in {}", known[0]),
            ),
            QuantityError::NoUnit => (
                value.span(),
                format!("`{key}` has no unit"),
                format!("append one, or leave out the quotes for {}", known[0]),
            ),
            QuantityError::NoNumber => (
                value.span(),
                format!("`{key}` is no quantity: {error}"),
                format!("write for instance {key} = \"1 {}\"", known[0]),
            ),
            QuantityError::NotFinite | QuantityError::TooSmall => {
                "a finite number".clone_into(&mut allowed);
                (value.span(), format!("`{key}`: {error}"), "correct the number".to_owned())
            }
        };
        Fault::new(span, message, allowed, help)
    }

    /// Span of `part` within the string `value`; of the whole value where escapes moved the text.
    fn part(&self, value: &Value<'_>, text: &str, part: &str) -> ops::Range<usize> {
        let whole = value.span();
        let raw = self.text.get(whole.clone()).unwrap_or_default();
        match (raw.find(text), text.rfind(part)) {
            (Some(start), Some(offset)) => {
                let start = whole.start + start + offset;
                start..start + part.len()
            }
            _ => whole,
        }
    }

    fn required(&self, key: &str, dimension: Dimension, range: Range, example: &str) -> Result<f64, Fault> {
        self.quantity(key, dimension, range)?.ok_or_else(|| self.missing(key, example))
    }

    /// Refuses the first of `keys` that is given.
    fn without(&self, keys: &[&str], why: &str) -> Result<(), Fault> {
        let given = keys.iter().filter(|key| self.get(key).is_some()).map(|key| (self.key_span(key), key));
        match given.min_by_key(|(span, _)| span.start) {
            None => Ok(()),
            Some((span, key)) => Err(Fault::new(
                span,
                format!("`{key}` has no place in {} here", self.name),
                why,
                format!("remove `{key}`"),
            )),
        }
    }
}

fn unknown_key(name: &str, key: &Spanned<toml::de::DeString<'_>>, known: &[&'static str]) -> Fault {
    let text = key.get_ref().as_ref();
    let help = nearest(text, known).map(did_you_mean).or_else(|| {
        let home = TABLES.iter().find(|(_, keys)| keys.contains(&text))?;
        Some(format!("`{text}` belongs to {}", home.0))
    });
    Fault::new(
        key.span(),
        format!("unknown key {} in {name}", quoted(text)),
        format!("known keys: {}", known.join(", ")),
        help.unwrap_or_else(|| "remove it".to_owned()),
    )
}

/// Remedy for a misspelt word.
pub(crate) fn did_you_mean(known: &str) -> String {
    format!("did you mean `{known}`?")
}

/// The one of `known` that `text` is most likely a misspelling of.
pub(crate) fn nearest<'a>(text: &str, known: &[&'a str]) -> Option<&'a str> {
    let distance = |known: &&str| strsim::damerau_levenshtein(&text.to_lowercase(), &known.to_lowercase());
    // A long text is no misspelling, and not worth the comparison.
    let candidates = known.iter().copied().filter(|_| text.len() <= QUOTE_LENGTH_MAX);
    let best = candidates.min_by_key(distance)?;
    let length = best.chars().count();
    // One slip in three letters; in two letters one; a unit of one letter has no misspelling.
    (distance(&best) <= (length / 3).max(1).min(length.saturating_sub(1))).then_some(best)
}

/// The value of a TOML number; `None` for anything else.
fn plain_number(value: &DeValue<'_>) -> Option<Result<f64, QuantityError>> {
    match value {
        DeValue::Float(float) => Some(units::number(&float.as_str().replace('_', ""))),
        DeValue::Integer(integer) => {
            let digits = integer.as_str().replace('_', "");
            Some(if integer.radix() == 10 {
                units::number(&digits)
            } else {
                u128::from_str_radix(&digits, integer.radix()).map(|n| n as f64).map_err(|_| QuantityError::NotFinite)
            })
        }
        _ => None,
    }
}

fn type_name(value: &DeValue<'_>) -> &'static str {
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

fn scene(text: &str) -> Result<Scene, Fault> {
    let document = DeTable::parse(text).map_err(|error| not_toml(text, &error))?;
    let root = Section::new("the scene", document.get_ref(), 0..0, text, ROOT)?;
    let title = root.string("title", "put the title in quotes")?.map(|(title, _)| title.to_owned());
    let velocity = match root.table("impact", "[impact]", IMPACT)? {
        None => None,
        Some(impact) => Some(impact.required(
            "velocity",
            Dimension::Velocity,
            Range::NotNegative,
            "\"300 m/s\", or drop [impact]",
        )?),
    };
    let criterion = root.table("perforation", "[perforation]", PERFORATION)?;
    let criterion = criterion.map_or(Ok(Criterion::default()), |section| read_criterion(&section, &root))?;
    let projectile = root
        .table("projectile", "[projectile]", PROJECTILE)?
        .ok_or_else(|| root.missing_table("[projectile]", "[projectile] with mass, diameter and nose"))?;
    let mass = projectile.required("mass", Dimension::Mass, Range::Positive, "\"2 kg\"")?;
    let target = root.table("target", "[target]", TARGET)?;
    let (resistance, thickness) = match root.tables("stage", "[[stage]]", STAGE)? {
        Some(sections) => outright(&root, &projectile, target.as_ref(), &sections)?,
        None => concrete(&root, &projectile, target.as_ref())?,
    };
    Ok(Scene { title, mass, resistance, thickness, criterion, velocity })
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
        "nest less deep: a scene needs three levels"
    } else if message.contains("carriage return") {
        "end the lines as Unix or Windows does"
    } else {
        "correct the syntax; strings need quotes"
    };
    Fault::new(span, format!("this is not TOML: {message}"), "TOML text", help)
}

fn read_criterion(section: &Section<'_, '_>, root: &Section<'_, '_>) -> Result<Criterion, Fault> {
    const CRITERIA: &[&str] = &["full-depth", "ndrc"];
    let Some((name, span)) = section.string("criterion", "write criterion = \"full-depth\"")? else {
        return Ok(Criterion::default());
    };
    match name {
        "full-depth" => Ok(Criterion::FullDepth),
        "ndrc" if root.get("stage").is_some() => Err(Fault::new(
            span,
            "`ndrc` needs a projectile diameter, and a scene of stages has none",
            "`full-depth` in a scene of stages",
            "write criterion = \"full-depth\"",
        )),
        "ndrc" => Ok(Criterion::Ndrc),
        _ => Err(Fault::new(
            span,
            format!("unknown criterion {}", quoted(name)),
            "`full-depth` or `ndrc`",
            nearest(name, CRITERIA).map_or_else(|| "write criterion = \"full-depth\"".to_owned(), did_you_mean),
        )),
    }
}

/// A scene that gives its stages outright.
fn outright(
    root: &Section<'_, '_>,
    projectile: &Section<'_, '_>,
    target: Option<&Section<'_, '_>>,
    sections: &[Section<'_, '_>],
) -> Result<(Resistance, Option<f64>), Fault> {
    projectile.without(&["diameter", "nose"], "with [[stage]], [projectile] has only `mass`")?;
    root.without(&["resistance"], "with [[stage]] there is no [resistance]")?;
    let thickness = match target {
        None => None,
        Some(target) => {
            target.without(&["strength", "density", "layer"], "with [[stage]], [target] has only `thickness`")?;
            target.quantity("thickness", Dimension::Length, Range::NotNegative)?
        }
    };
    let mut stages: Vec<Stage> = Vec::with_capacity(sections.len());
    for (index, section) in sections.iter().enumerate() {
        let read = |key, dimension, range| Ok(section.quantity(key, dimension, range)?.unwrap_or(0.0));
        let end = section.quantity("end", Dimension::Length, Range::NotNegative)?;
        let stage = Stage {
            static_force: read("static_force", Dimension::Force, Range::Finite)?,
            stiffness: read("stiffness", Dimension::Stiffness, Range::NotNegative)?,
            viscosity: read("viscosity", Dimension::Viscosity, Range::NotNegative)?,
            drag: read("drag", Dimension::Drag, Range::NotNegative)?,
            end: end.unwrap_or(f64::INFINITY),
        };
        if end.is_none() && index + 1 < sections.len() {
            return Err(Fault::new(
                section.span.clone(),
                "this stage has no `end`, and another follows",
                "only the last stage goes without an `end`",
                "give it an `end`, or remove the stages behind it",
            ));
        }
        let previous = stages.last().map_or(0.0, |previous| previous.end);
        if stage.end < previous {
            return Err(Fault::new(
                section.get("end").map_or(0..0, Spanned::span),
                format!("this stage ends at {} m, in front of where it begins", Shown(stage.end)),
                format!("an end at {} m or beyond", Shown(previous)),
                "give the ends in order, each from the impact face",
            ));
        }
        stages.push(stage);
    }
    if let Some((section, stage)) = sections.last().zip(stages.last())
        && stage.end < thickness.unwrap_or(f64::INFINITY)
    {
        return Err(Fault::new(
            section.get("end").map_or(0..0, Spanned::span),
            "the last stage ends inside the target",
            "no `end` in the last stage, or one at the target's thickness or beyond",
            "leave out this `end`, or add the stage that follows",
        ));
    }
    Ok((Resistance::Stages(stages), thickness))
}

/// A scene of Eq. 4-5.
fn concrete(
    root: &Section<'_, '_>,
    projectile: &Section<'_, '_>,
    target: Option<&Section<'_, '_>>,
) -> Result<(Resistance, Option<f64>), Fault> {
    let diameter = projectile.required("diameter", Dimension::Length, Range::Positive, "\"50 mm\"")?;
    let nose_factor = projectile
        .table("nose", "the nose", NOSE)?
        .ok_or_else(|| projectile.missing("nose", "{ shape = \"flat\" }"))
        .and_then(|nose| nose_factor(&nose))?;
    let resistance = root.table("resistance", "[resistance]", RESISTANCE)?;
    let number = |key, range| resistance.as_ref().map_or(Ok(None), |section| section.number(key, range));
    let static_factor = number("S", Range::Positive)?;
    let inertia_factor = number("B", Range::NotNegative)?.unwrap_or(1.0);
    let crater_ratio = number("k", Range::NotNegative)?.unwrap_or(fault!("default-k", 2.0, 1.0));
    let crater_stiffness =
        resistance.as_ref().map_or(Ok(CraterStiffness::Continuous), |section| crater_stiffness(section))?;
    let target =
        target.ok_or_else(|| root.missing_table("[target]", "[target] with strength and density, or stages"))?;
    let layers = layers(target, static_factor)?;
    let thickness = if layers.is_empty() {
        target.quantity("thickness", Dimension::Length, Range::NotNegative)?
    } else {
        total_thickness(target, &layers)?
    };
    let medium = match layer_beyond(&layers, crater_ratio * diameter) {
        Some(index) => layers[index],
        None => medium(target, static_factor, Range::Positive, f64::INFINITY)?,
    };
    let concrete = Concrete {
        diameter,
        nose_factor,
        strength: medium.strength,
        density: medium.density,
        static_factor: medium.static_factor,
        inertia_factor,
        crater_ratio,
        crater_stiffness,
        layers,
    };
    Ok((Resistance::Concrete(concrete), thickness))
}

/// Strength, density and S of a target or a layer.
fn medium(
    section: &Section<'_, '_>,
    static_factor: Option<f64>,
    strength_range: Range,
    thickness: f64,
) -> Result<Layer, Fault> {
    let strength = section.required("strength", Dimension::Pressure, strength_range, "\"36 MPa\"")?;
    let density = section.required("density", Dimension::Density, Range::NotNegative, "\"2300 kg/m^3\"")?;
    // An air gap has no strength for Eq. 14 to go by, and needs none.
    let eq14 = if strength == 0.0 { 0.0 } else { semi_empirical::static_factor(strength) };
    Ok(Layer { thickness, strength, density, static_factor: static_factor.unwrap_or(eq14), viscosity: 0.0 })
}

/// The layers from the impact face on; empty without any.
fn layers(target: &Section<'_, '_>, static_factor: Option<f64>) -> Result<Vec<Layer>, Fault> {
    let Some(sections) = target.tables("layer", "[[target.layer]]", LAYER)? else { return Ok(Vec::new()) };
    target.without(&["strength", "density", "thickness"], "with [[target.layer]], each layer has its own")?;
    let read = |(index, section): (usize, &Section<'_, '_>)| {
        let thickness = section.quantity("thickness", Dimension::Length, Range::NotNegative)?;
        let thickness = match thickness {
            Some(thickness) => thickness,
            None if index + 1 == sections.len() => f64::INFINITY,
            None => return Err(section.missing("thickness", "\"100 mm\": only the last layer goes without")),
        };
        let own_factor = section.number("S", Range::Positive)?.or(static_factor);
        let viscosity = section.quantity("viscosity", Dimension::Viscosity, Range::NotNegative)?.unwrap_or(0.0);
        Ok(Layer { viscosity, ..medium(section, own_factor, Range::NotNegative, thickness)? })
    };
    sections.iter().enumerate().map(read).collect()
}

/// H of a layered target; `None` when the last layer has no end.
fn total_thickness(target: &Section<'_, '_>, layers: &[Layer]) -> Result<Option<f64>, Fault> {
    // Summed from the face on, as the ends of the layers are.
    let sum = layers.iter().fold(0.0, |sum, layer| sum + layer.thickness);
    let open = layers.last().is_some_and(|last| last.thickness.is_infinite());
    match (open, sum.is_finite()) {
        (true, _) => Ok(None),
        (false, true) => Ok(Some(sum)),
        (false, false) => Err(Fault::new(
            target.key_span("layer"),
            "the layers sum up to no finite thickness",
            "a finite sum",
            "correct the thicknesses",
        )),
    }
}

fn crater_stiffness(section: &Section<'_, '_>) -> Result<CraterStiffness, Fault> {
    const KEY: &str = "crater_stiffness";
    if let Some(value) = section.get(KEY)
        && let DeValue::String(text) = value.get_ref()
    {
        if text.trim() == "continuous" {
            return Ok(CraterStiffness::Continuous);
        }
        if units::split(text.trim()).0.is_empty() {
            return Err(Fault::new(
                value.span(),
                format!("unknown crater stiffness {}", quoted(text)),
                "`continuous`, or a stiffness such as \"8.48e6 N/m\"",
                nearest(text, &["continuous"]).map_or_else(|| "write \"continuous\"".to_owned(), did_you_mean),
            ));
        }
    }
    let given = section.quantity(KEY, Dimension::Stiffness, Range::Positive)?;
    Ok(given.map_or(CraterStiffness::Continuous, CraterStiffness::Given))
}

/// N* of the nose, given as such or by a shape.
fn nose_factor(nose: &Section<'_, '_>) -> Result<f64, Fault> {
    const SHAPES: &[&str] = &["flat", "ogive", "cone", "spherical"];
    const PARAMETERS: &[&str] = &["caliber_radius_head", "length_ratio", "radius_ratio"];
    let factor = nose.number("factor", Range::UnitInterval)?;
    let shape = nose.string("shape", "write shape = \"flat\"")?;
    let (shape, span) = match (factor, shape) {
        (Some(_), Some(_)) => {
            return Err(Fault::new(
                nose.key_span("shape"),
                "the nose has both a `factor` and a `shape`",
                "exactly one of `factor` and `shape`",
                "remove one of the two",
            ));
        }
        (None, None) => {
            return Err(Fault::new(
                nose.span.clone(),
                "the nose has neither a `factor` nor a `shape`",
                "exactly one of `factor` and `shape`",
                "write { factor = 0.72 } or { shape = \"flat\" }",
            ));
        }
        (Some(factor), None) => {
            nose.without(PARAMETERS, "a `factor` takes no parameter of a shape")?;
            return Ok(factor);
        }
        (None, Some(shape)) => shape,
    };
    let (parameter, range, why) = match shape {
        "flat" => {
            nose.without(PARAMETERS, "the shape `flat` takes no parameter")?;
            return Ok(NoseShape::Flat.factor());
        }
        "ogive" => (PARAMETERS[0], Range::AtLeastHalf, "the shape `ogive` takes `caliber_radius_head`"),
        "cone" => (PARAMETERS[1], Range::Positive, "the shape `cone` takes `length_ratio`"),
        "spherical" => (PARAMETERS[2], Range::AtLeastHalf, "the shape `spherical` takes `radius_ratio`"),
        _ => {
            return Err(Fault::new(
                span,
                format!("unknown nose shape {}", quoted(shape)),
                format!("one of {}", SHAPES.join(", ")),
                nearest(shape, SHAPES)
                    .map_or_else(|| "give the nose factor: { factor = 0.72 }".to_owned(), did_you_mean),
            ));
        }
    };
    let others: Vec<_> = PARAMETERS.iter().copied().filter(|other| *other != parameter).collect();
    nose.without(&others, why)?;
    let ratio = nose.number(parameter, range)?.ok_or_else(|| nose.missing(parameter, "3.0"))?;
    Ok(match shape {
        "ogive" => NoseShape::Ogive { caliber_radius_head: ratio },
        "cone" => NoseShape::Cone { length_ratio: ratio },
        _ => NoseShape::Spherical { radius_ratio: ratio },
    }
    .factor())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;
    use insta::assert_snapshot;

    use super::*;
    use crate::physics::scene::tests as shot_14;
    use crate::physics::{Problem, Target};

    /// The contract's example, every table and key in it.
    const FULL: &str = r#"title = "tunnel stop, blunt nose"
[projectile]
mass = "2 kg"
diameter = "50 mm"
nose = { factor = 0.72 }
[target]
strength = "36 MPa"
density = "2300 kg/m^3"
thickness = "180 mm"
[resistance]
S = 12.0
B = 1.0
k = 2.0
crater_stiffness = "8.48e6 N/m"
[impact]
velocity = "300 m/s"
[perforation]
criterion = "ndrc"
"#;

    /// A scene of two stages.
    const STAGES: &str = r#"[projectile]
mass = 2
[[stage]]
stiffness = "8 MN/m"
viscosity = "1e3 kg/s"
end = "0.1 m"
[[stage]]
static_force = "-10 N"
drag = "3 kg/m"
[impact]
velocity = 300
"#;

    fn read(text: &str) -> Scene {
        Scene::from_toml(text, "scene.toml").unwrap_or_else(|error| panic!("{}", error.render(false)))
    }

    fn refuse(text: &str) -> Box<SceneError> {
        Scene::from_toml(text, "scene.toml").unwrap_err()
    }

    /// `FULL` with `from` replaced; the test would be void if it were not there.
    fn with(from: &str, to: &str) -> String {
        assert!(FULL.contains(from), "{from}");
        FULL.replace(from, to)
    }

    fn in_stages(from: &str, to: &str) -> String {
        assert!(STAGES.contains(from), "{from}");
        STAGES.replace(from, to)
    }

    fn shipped(name: &str) -> Problem {
        let (name, text) = SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap();
        Scene::from_toml(text, name).unwrap().problem().unwrap()
    }

    #[test]
    fn every_key_of_the_contract_is_read() {
        let concrete = Concrete {
            diameter: 0.05,
            nose_factor: 0.72,
            strength: 36e6,
            density: 2300.0,
            static_factor: 12.0,
            inertia_factor: 1.0,
            crater_ratio: 2.0,
            crater_stiffness: CraterStiffness::Given(8.48e6),
            layers: Vec::new(),
        };
        let scene = Scene {
            title: Some("tunnel stop, blunt nose".to_owned()),
            mass: 2.0,
            resistance: Resistance::Concrete(concrete),
            thickness: Some(0.18),
            criterion: Criterion::Ndrc,
            velocity: Some(300.0),
        };
        assert_eq!(read(FULL), scene);
    }

    #[test]
    fn everything_optional_has_the_default_of_the_contract() {
        let scene = read(
            r#"
            [projectile]
            mass = 2
            diameter = 0.05
            nose.shape = "flat"
            [target]
            strength = 36e6
            density = 2_300"#,
        );
        let concrete = scene.concrete().unwrap();
        assert_eq!((concrete.static_factor, concrete.inertia_factor, concrete.crater_ratio), (12.0, 1.0, 2.0));
        assert_eq!(concrete.crater_stiffness, CraterStiffness::Continuous);
        assert_eq!((concrete.nose_factor, concrete.density), (1.0, 2300.0));
        assert_eq!((scene.title, scene.thickness, scene.velocity), (None, None, None));
        assert_eq!(scene.criterion, Criterion::FullDepth);
    }

    #[test]
    fn stages_are_read_as_given_and_a_key_left_out_is_0() {
        let scene = read(STAGES);
        let crater = Stage { static_force: 0.0, stiffness: 8e6, viscosity: 1e3, drag: 0.0, end: 0.1 };
        let tunnel = Stage { static_force: -10.0, stiffness: 0.0, viscosity: 0.0, drag: 3.0, end: f64::INFINITY };
        assert_eq!(scene.resistance, Resistance::Stages(vec![crater, tunnel]));
        let closed = in_stages("[impact]", "end = 0.3\n[target]\nthickness = \"30 cm\"\n[impact]");
        assert_eq!(read(&closed).problem().unwrap().exit_depth, 0.3);
    }

    #[test]
    fn noses_are_read_by_shape() {
        for (nose, factor) in [
            ("{ shape = \"flat\" }", 1.0),
            ("{ shape = \"ogive\", caliber_radius_head = 2 }", 0.15625),
            ("{ shape = \"cone\", length_ratio = 1.0 }", 0.2),
            ("{ shape = \"spherical\", radius_ratio = 0.5 }", 0.5),
            ("{ factor = 0 }", 0.0),
        ] {
            let scene = read(&with("{ factor = 0.72 }", nose));
            assert_relative_eq!(scene.concrete().unwrap().nose_factor, factor, max_relative = 1e-15);
        }
    }

    #[test]
    fn layers_sum_up_and_the_one_beyond_the_crater_stands_for_the_target() {
        let problem = shipped("layered");
        assert_eq!((problem.target, problem.crater), (Target::Stages, Some(0)));
        assert_eq!(problem.stages.iter().map(|stage| stage.end).collect::<Vec<_>>(), [0.1, 0.12, 0.2, f64::INFINITY]);
        assert_relative_eq!(problem.exit_depth, 0.4, max_relative = 1e-15);
        let (_, text) = SHIPPED.iter().find(|(name, _)| *name == "layered").unwrap();
        let gap = text.replace("25 MPa", "0 MPa").replace("thickness = \"200 mm\"\n", "S = 10\nviscosity = 5\n");
        let scene = read(&gap.replace("velocity = \"250 m/s\"", "velocity = 1"));
        let concrete = scene.concrete().unwrap();
        assert_eq!((concrete.strength, scene.thickness), (60e6, None));
        assert_eq!((concrete.layers[1].static_factor, concrete.layers[2].static_factor), (0.0, 10.0));
        assert_eq!((concrete.layers[2].viscosity, concrete.layers[2].thickness), (5.0, f64::INFINITY));
        assert!(scene.problem().is_ok());
    }

    #[test]
    fn shipped_scenes_are_the_files_and_each_resolves_with_a_title_and_a_comment() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/scenes");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), SHIPPED.len());
        for (name, text) in SHIPPED {
            let scene = Scene::read(&folder.join(name).with_extension("toml")).unwrap();
            assert_eq!(scene, Scene::from_toml(text, name).unwrap());
            assert!(scene.problem().is_ok() && scene.title.is_some() && text.starts_with("# "), "{name}");
        }
    }

    #[test]
    fn the_shipped_shot_is_the_one_of_forrestal() {
        let scene = Scene { title: None, ..read(SHIPPED[0].1) };
        assert_eq!(scene, shot_14::scene());
    }

    #[test]
    fn paper_slab_and_stage_scenes_are_what_their_comments_say() {
        let paper = shipped("paper-slab");
        assert_relative_eq!(paper.mass / (2400.0 * 0.06_f64.powi(3)), 38.58, epsilon = 5e-3);
        assert_eq!((paper.exit_depth, paper.stages[0].end), (0.3, 0.12));
        let stiff = shipped("stiff");
        assert_eq!((stiff.exit_depth, stiff.stages[0].static_force, stiff.stages.len()), (9.0, -1000.0, 1));
        let viscous = shipped("viscous");
        assert!(viscous.stages[0].resists() && !viscous.has_exit());
        assert_eq!(viscous.stages[0].viscosity, stiff.stages[0].viscosity);
        assert_eq!(shipped("graze").exit_depth, 0.200_771_166_635);
    }

    #[test]
    fn a_byte_order_mark_and_windows_line_ends_are_no_fault() {
        let text = text_of([b"\xef\xbb\xbf", FULL.replace('\n', "\r\n").as_bytes()].concat(), "scene.toml").unwrap();
        assert_eq!(read(&text), read(FULL));
        let bad = refuse(&text.replace("36 MPa", "36 m"));
        assert_eq!(bad.location(), "scene.toml:7:16");
        assert!(!bad.render(false).contains('?'), "{}", bad.render(false));
        let first_line = text_of(b"\xef\xbb\xbfx = 1".to_vec(), "scene.toml").unwrap();
        assert_eq!(refuse(&first_line).place.unwrap().span, 0..1);
    }

    /// Each refusal as a person sees it.
    #[test]
    #[expect(clippy::too_many_lines, reason = "the lines are what a person sees")]
    fn refusals_underline_the_fault_and_say_what_to_do() {
        let rendered = |text: String| refuse(&text).render(false);
        assert_snapshot!(rendered(with("\"2 kg\"", "\"2 m\"")), @r#"
        Error: `mass` takes a mass; `m` is a unit of length
           ╭─[ scene.toml:3:11 ]
           │
         3 │ mass = "2 m"
           │           ┬
           │           ╰── a mass, in kg, g, t, mg, lb, oz and others
           │
           │ Help: give it in kg
        ───╯
        "#);
        assert_snapshot!(rendered(with("50 mm", "50 furlong")), @r#"
        Error: `furlong` is no unit that is known
           ╭─[ scene.toml:4:16 ]
           │
         4 │ diameter = "50 furlong"
           │                ───┬───
           │                   ╰───── a length, in m, mm, cm, µm, km, in, ft and others
           │
           │ Help: give it in m
        ───╯
        "#);
        assert_snapshot!(rendered(with("36 MPa", "36 MPA")), @r#"
        Error: `MPA` is no unit that is known
           ╭─[ scene.toml:7:16 ]
           │
         7 │ strength = "36 MPA"
           │                ─┬─
           │                 ╰─── a pressure, in Pa, kPa, MPa, GPa, bar, psi, ksi and others
           │
           │ Help: did you mean `MPa`?
        ───╯
        "#);
        assert_snapshot!(rendered(with("diameter", "diametr")), @r#"
        Error: unknown key `diametr` in [projectile]
           ╭─[ scene.toml:4:1 ]
           │
         4 │ diametr = "50 mm"
           │ ───┬───
           │    ╰───── known keys: mass, diameter, nose
           │
           │ Help: did you mean `diameter`?
        ───╯
        "#);
        assert_snapshot!(rendered(with("mass = \"2 kg\"\n", "")), @r#"
        Error: [projectile] has no `mass`
           ╭─[ scene.toml:2:1 ]
           │
         2 │ [projectile]
           │ ──────┬─────
           │       ╰─────── `mass` is required here
           │
           │ Help: add mass = "2 kg"
        ───╯
        "#);
        assert_snapshot!(rendered(with("B = 1.0", "S = 1.0")), @r#"
        Error: `S` is given twice
            ╭─[ scene.toml:12:1 ]
            │
         12 │ S = 1.0
            │ ┬
            │ ╰── each key and table once
            │
            │ Help: remove one of the two
        ────╯
        "#);
        assert_snapshot!(rendered(with("k = 2.0", "k = \"2.0\"")), @r#"
        Error: `k` is a string
            ╭─[ scene.toml:13:5 ]
            │
         13 │ k = "2.0"
            │     ──┬──
            │       ╰──── must be a number >= 0, without unit or quotes
            │
            │ Help: write for instance k = 2.0
        ────╯
        "#);
        assert_snapshot!(rendered(with("\"300 m/s\"", "inf")), @r#"
        Error: `velocity`: the number is not finite in 64 bits
            ╭─[ scene.toml:16:12 ]
            │
         16 │ velocity = inf
            │            ─┬─
            │             ╰─── a number >= 0
            │
            │ Help: correct the number
        ────╯
        "#);
        assert_snapshot!(rendered(with("180 mm", "-180 mm")), @r#"
        Error: `thickness = "-180 mm"` is out of range
           ╭─[ scene.toml:9:13 ]
           │
         9 │ thickness = "-180 mm"
           │             ────┬────
           │                 ╰────── a number >= 0
           │
           │ Help: correct `thickness`; it is read in m as -0.18
        ───╯
        "#);
        assert_snapshot!(rendered(with("{ factor = 0.72 }", "{ factor = 0.72, shape = \"flat\" }")), @r#"
        Error: the nose has both a `factor` and a `shape`
           ╭─[ scene.toml:5:25 ]
           │
         5 │ nose = { factor = 0.72, shape = "flat" }
           │                         ──┬──
           │                           ╰──── exactly one of `factor` and `shape`
           │
           │ Help: remove one of the two
        ───╯
        "#);
        assert_snapshot!(rendered(with("{ factor = 0.72 }", "{ shape = \"ogive\", length_ratio = 3.0 }")), @r#"
        Error: `length_ratio` has no place in the nose here
           ╭─[ scene.toml:5:27 ]
           │
         5 │ nose = { shape = "ogive", length_ratio = 3.0 }
           │                           ──────┬─────
           │                                 ╰─────── the shape `ogive` takes `caliber_radius_head`
           │
           │ Help: remove `length_ratio`
        ───╯
        "#);
        assert_snapshot!(rendered(with("\"ndrc\"", "\"ndcr\"")), @r#"
        Error: unknown criterion `ndcr`
            ╭─[ scene.toml:18:13 ]
            │
         18 │ criterion = "ndcr"
            │             ───┬──
            │                ╰──── `full-depth` or `ndrc`
            │
            │ Help: did you mean `ndrc`?
        ────╯
        "#);
        assert_snapshot!(rendered(in_stages("mass = 2", "mass = 2\ndiameter = \"50 mm\"")), @r#"
        Error: `diameter` has no place in [projectile] here
           ╭─[ scene.toml:3:1 ]
           │
         3 │ diameter = "50 mm"
           │ ────┬───
           │     ╰───── with [[stage]], [projectile] has only `mass`
           │
           │ Help: remove `diameter`
        ───╯
        "#);
        assert_snapshot!(rendered(in_stages("drag", "end = \"9 cm\"\ndrag")), @r#"
        Error: this stage ends at 0.09 m, in front of where it begins
           ╭─[ scene.toml:9:7 ]
           │
         9 │ end = "9 cm"
           │       ───┬──
           │          ╰──── an end at 0.1 m or beyond
           │
           │ Help: give the ends in order, each from the impact face
        ───╯
        "#);
        assert_snapshot!(rendered(in_stages("end = \"0.1 m\"\n", "")), @r#"
        Error: this stage has no `end`, and another follows
           ╭─[ scene.toml:3:1 ]
           │
         3 │ [[stage]]
           │ ────┬────
           │     ╰────── only the last stage goes without an `end`
           │
           │ Help: give it an `end`, or remove the stages behind it
        ───╯
        "#);
        assert_snapshot!(rendered(FULL.replace("]\nvelocity", "\nvelocity")), @r#"
        Error: this is not TOML: unclosed table, expected `]`
            ╭─[ scene.toml:15:8 ]
            │
         15 │ [impact
            │        │
            │        ╰─ TOML text
            │
            │ Help: correct the syntax; strings need quotes
        ────╯
        "#);
        assert_snapshot!(rendered(String::new()), @r#"
        Error: the scene has no [projectile]
           ╭─[ scene.toml:1:1 ]
           │
         1 │
           │ │
           │ ╰─ [projectile] is required
           │
           │ Help: add [projectile] with mass, diameter and nose
        ───╯
        "#);
    }

    /// Edits of `FULL` or `STAGES`, each with the place and the message of its refusal.
    #[test]
    fn every_other_refusal_of_the_contract_names_its_place_and_cause() {
        let nose = "{ factor = 0.72 }";
        for (text, place, message) in [
            (with("\"2 kg\"", "\"2\""), "3:8", "`mass` has no unit"),
            (with("\"2 kg\"", "\"kg\""), "3:8", "`mass` is no quantity: there is no number in front of the unit"),
            (with("\"2 kg\"", "true"), "3:8", "`mass` is a truth value"),
            (with("\"2 kg\"", "\"nan kg\""), "3:8", "`mass`: the number is not finite in 64 bits"),
            (with("\"2 kg\"", "1e400"), "3:8", "`mass`: the number is not finite in 64 bits"),
            (
                with("\"2 kg\"", "1e-400"),
                "3:8",
                "`mass`: the number is too small for 64 bits: below 2.3e-308 its digits are lost",
            ),
            (with("\"2 kg\"", "1979-05-27"), "3:8", "`mass` is a date or time"),
            (with("50 mm", "1,5 mm"), "4:14", "`,5 mm` is no unit that is known"),
            (with("title = \"tunnel stop, blunt nose\"", "title = 3"), "1:9", "`title` is an integer"),
            (with("mass", "zz = 1\naa = 2\nmass"), "3:1", "unknown key `zz` in [projectile]"),
            (with("[target]", "[taget]"), "6:2", "unknown key `taget` in the scene"),
            (with("[target]\n", "[target]\nk = 2\n"), "7:1", "unknown key `k` in [target]"),
            (with("[resistance]", "[target]"), "10:2", "`target` is given twice"),
            (with("strength = \"36 MPa\"\n", ""), "6:1", "[target] has no `strength`"),
            (with("density = \"2300 kg/m^3\"\n", ""), "6:1", "[target] has no `density`"),
            (with("diameter = \"50 mm\"\n", ""), "2:1", "[projectile] has no `diameter`"),
            (with("nose = { factor = 0.72 }\n", ""), "2:1", "[projectile] has no `nose`"),
            (with("velocity = \"300 m/s\"\n", ""), "15:1", "[impact] has no `velocity`"),
            (with(nose, "0.72"), "5:8", "`nose` is a number"),
            (with(nose, "{}"), "5:8", "the nose has neither a `factor` nor a `shape`"),
            (with(nose, "{ factor = 1.01 }"), "5:19", "`factor = 1.01` is out of range"),
            (with(nose, "{ factor = \"0.7\" }"), "5:19", "`factor` is a string"),
            (
                with(nose, "{ factor = 0.7, length_ratio = 1.0 }"),
                "5:24",
                "`length_ratio` has no place in the nose here",
            ),
            (
                with(nose, "{ shape = \"flat\", radius_ratio = 1.0 }"),
                "5:26",
                "`radius_ratio` has no place in the nose here",
            ),
            (with(nose, "{ shape = \"ogiv\" }"), "5:18", "unknown nose shape `ogiv`"),
            (with(nose, "{ shape = 3 }"), "5:18", "`shape` is an integer"),
            (with(nose, "{ shape = \"cone\" }"), "5:8", "the nose has no `length_ratio`"),
            (with("8.48e6 N/m", "continous"), "14:20", "unknown crater stiffness `continous`"),
            (
                with("8.48e6 N/m", "8.48e6 N"),
                "14:28",
                "`crater_stiffness` takes a stiffness (force per length); `N` is a unit of force",
            ),
            (with("[target]\n", "[target]\nlayer = []\n"), "7:9", "`layer` is empty"),
            (with("[target]\n", "[target]\nlayer = 3\n"), "7:9", "`layer` is an integer"),
            (with("[resistance]", "[[target.layer]]\n[resistance]"), "7:1", "`strength` has no place in [target] here"),
            (
                in_stages("[impact]", "[resistance]\nk = 2\n[impact]"),
                "10:2",
                "`resistance` has no place in the scene here",
            ),
            (
                in_stages("[impact]", "[target]\ndensity = 1\n[impact]"),
                "11:1",
                "`density` has no place in [target] here",
            ),
            (
                in_stages("[impact]", "[perforation]\ncriterion = \"ndrc\"\n[impact]"),
                "11:13",
                "`ndrc` needs a projectile diameter, and a scene of stages has none",
            ),
            (
                in_stages("[impact]", "end = 1\n[target]\nthickness = 2\n[impact]"),
                "10:7",
                "the last stage ends inside the target",
            ),
            (in_stages("[impact]", "end = 1\n[impact]"), "10:7", "the last stage ends inside the target"),
            (STAGES.replace("[[stage]]", "[stage]"), "7:2", "`stage` is given twice"),
            ("stage = []\nprojectile.mass = 1".to_owned(), "1:9", "`stage` is empty"),
            ("[stage]\n[projectile]\nmass = 1".to_owned(), "1:1", "`stage` is a table"),
            ("stage = [3]\nprojectile.mass = 1".to_owned(), "1:10", "`stage` is an integer"),
            ("projectile = 3".to_owned(), "1:14", "`projectile` is an integer"),
            ("projectile.mss = 3".to_owned(), "1:12", "unknown key `mss` in [projectile]"),
        ] {
            let error = refuse(&text);
            assert_eq!((error.location(), error.message.as_str()), (format!("scene.toml:{place}"), message), "{text}");
            assert!(!error.allowed.is_empty() && !error.help.is_empty(), "{message}");
        }
    }

    #[test]
    fn admissible_ranges_are_those_of_the_contract() {
        let (nan, inf) = ("nan", "inf");
        let ogive = "{ shape = \"ogive\", caliber_radius_head = VALUE }";
        let cone = "{ shape = \"cone\", length_ratio = VALUE }";
        let cap = "{ shape = \"spherical\", radius_ratio = VALUE }";
        let layer = "layer = [{ thickness = 1, strength = 0, density = VALUE, viscosity = 1 }]\n";
        let nose = "{ factor = 0.72 }";
        for (from, to, inside, outside) in [
            ("\"2 kg\"", "VALUE", ["2.2250738585072014e-308", "1e300"], ["0", "-1"]),
            ("\"50 mm\"", "VALUE", ["1e-6", "1e3"], ["0.0", "-1"]),
            ("\"36 MPa\"", "VALUE", ["1", "1e9"], ["-0.0", "-1"]),
            ("12.0", "VALUE", ["1e-3", "1e3"], ["0", "-12.0"]),
            ("\"8.48e6 N/m\"", "VALUE", ["1", "1e12"], ["0", "-1"]),
            ("0.72", "VALUE", ["0", "1"], ["-0.1", "1.1"]),
            (nose, ogive, ["0.5", "1e9"], ["0.4999", "-1"]),
            (nose, cap, ["0.5", "1e9"], ["0.4999", "0"]),
            (nose, cone, ["1e-9", "1e9"], ["0", "-1"]),
            ("\"2300 kg/m^3\"", "VALUE", ["0", "-0.0"], ["-1", "-1e-300"]),
            ("B = 1.0", "B = VALUE", ["0", "1.1"], ["-1", "-0.1"]),
            ("k = 2.0", "k = VALUE", ["0", "1e-8"], ["-1", "-0.1"]),
            ("\"180 mm\"", "VALUE", ["0", "1e3"], ["-1", "-0.1"]),
            ("\"300 m/s\"", "VALUE", ["0", "1e4"], ["-1", "-0.1"]),
        ] {
            let text = |value: &str| with(from, &to.replace("VALUE", value));
            for value in inside {
                read(&text(value));
            }
            for value in outside.into_iter().chain([nan, inf, "-inf", "\"\"", "[]"]) {
                let error = refuse(&text(value));
                assert!(!error.message.is_empty() && error.place.is_some(), "{from} = {value}: {error}");
            }
        }
        for key in ["static_force", "stiffness", "viscosity", "drag", "end"] {
            let text =
                |value: &str| format!("projectile.mass = 1\n[[stage]]\n{key} = {value}\n[target]\nthickness = 0");
            read(&text("0"));
            read(&text("1e300"));
            assert_eq!(Scene::from_toml(&text("-1"), "").is_ok(), key == "static_force", "{key}");
            for value in [nan, inf, "-inf"] {
                refuse(&text(value));
            }
        }
        let target = "strength = \"36 MPa\"\ndensity = \"2300 kg/m^3\"\nthickness = \"180 mm\"\n";
        read(&with(target, &layer.replace("VALUE", "0")));
        refuse(&with(target, &layer.replace("VALUE", "-1")));
        refuse(&with(target, &layer.replace("VALUE", "1").replace("strength = 0", "strength = -1")));
        refuse(&with(target, &layer.replace("VALUE", "1").replace("viscosity = 1", "viscosity = -1")));
    }

    #[test]
    fn only_the_last_layer_goes_without_a_thickness_and_the_sum_is_finite() {
        let (_, text) = SHIPPED.iter().find(|(name, _)| *name == "layered").unwrap();
        let error = refuse(&text.replace("thickness = \"80 mm\"\n", ""));
        assert_eq!(error.message, "[[target.layer]] has no `thickness`");
        assert_eq!(error.place.unwrap().line, 16);
        let huge = text.replace("80 mm", "1.7e308 m").replace("200 mm", "1.7e308 m");
        assert_eq!(refuse(&huge).message, "the layers sum up to no finite thickness");
    }

    #[test]
    fn a_static_factor_of_the_scene_holds_for_layers_without_their_own() {
        let (_, text) = SHIPPED.iter().find(|(name, _)| *name == "layered").unwrap();
        let scene = read(&text.replace("k = 2.0", "k = 2.0\nS = 9.0").replacen("density", "S = 7.0\ndensity", 1));
        let factors: Vec<_> = scene.concrete().unwrap().layers.iter().map(|layer| layer.static_factor).collect();
        assert_eq!(factors, [7.0, 9.0, 9.0]);
    }

    #[test]
    fn unreadable_files_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let refused = |path: &Path| {
            let error = Scene::read(path).unwrap_err();
            assert!(error.render(false).contains(&error.location()), "{error}");
            (error.place.clone(), error.message)
        };
        assert_eq!(refused(folder.path()), (None, "this is a directory".to_owned()));
        let (place, message) = refused(&at("absent.toml"));
        assert!(place.is_none() && message.starts_with("the file cannot be read: "), "{message}");
        std::fs::write(at("limit.toml"), [FULL, &"#".repeat((1 << 20) - FULL.len())].concat()).unwrap();
        assert!(Scene::read(&at("limit.toml")).is_ok());
        std::fs::write(at("large.toml"), [FULL, &"#".repeat((1 << 20) - FULL.len() + 1)].concat()).unwrap();
        let too_large = (None, "the file is larger than 1 MiB, and was not read".to_owned());
        assert_eq!(refused(&at("large.toml")), too_large);
        // A file whose length is known only by reading it.
        #[cfg(target_os = "linux")]
        assert_eq!(refused(Path::new("/dev/zero")), too_large);
    }

    #[test]
    fn bytes_that_are_not_utf_8_are_refused_at_their_place() {
        let error = text_of(b"title = \"\xc3\xa4\"\nx = \"\xff\xfe\"".to_vec(), "scene.toml").unwrap_err();
        assert_eq!(error.location(), "scene.toml:2:6");
        assert_eq!(error.message, "the byte 0xff is not UTF-8");
        assert_snapshot!(error.render(false), @r#"
        Error: the byte 0xff is not UTF-8
           ╭─[ scene.toml:2:6 ]
           │
         2 │ x = "��"
           │      ┬
           │      ╰── UTF-8 text
           │
           │ Help: save the file in UTF-8
        ───╯
        "#);
    }

    #[test]
    fn no_file_steers_the_terminal_that_shows_it() {
        let hostile = "[projectile]\n\"ma\\u001b[31mss\\u202e\" = 1 # \u{1b}]0;owned\u{7}\u{9b}\u{202e}";
        let hostiles = [hostile.to_owned(), hostile.replace('#', "\n#"), format!("x = {hostile}"), "a\rb".to_owned()];
        for text in hostiles {
            let error = Scene::from_toml(&text, "evil\u{1b}[2J.toml").unwrap_err();
            for shown in [error.render(false), error.to_string()] {
                let steers = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
                assert!(!shown.chars().any(steers), "{shown:?}");
            }
        }
    }

    #[test]
    fn a_carriage_return_stays_only_as_part_of_a_line_end() {
        assert_eq!(printable("a\rb\r\nc\n\rd\r"), "a?b\r\nc\n?d?");
    }

    #[test]
    fn a_quoted_piece_is_cut_after_60_characters_and_says_so() {
        for (length, shown, end) in [(59, 59, ""), (60, 60, ""), (61, 60, "…"), (62, 60, "…"), (200, 60, "…")] {
            assert_eq!(quoted(&"ü".repeat(length)), format!("`{}{end}`", "ü".repeat(shown)), "{length}");
        }
    }

    #[test]
    fn a_line_is_underlined_up_to_240_characters() {
        // Neither the line before, which ends in a letter of two bytes, nor the one behind counts.
        for (length, underlined) in [(1, true), (239, true), (240, true), (241, false), (242, false)] {
            let line = if length == 1 { "x".to_owned() } else { format!("x = 1 # {}", "ü".repeat(length - 8)) };
            let error = SceneError::at("f", &format!("# é\n{line}\ny = 1\n"), 5..6, "no", "yes", "go");
            assert_eq!(error.location(), "f:2:1");
            assert_eq!(error.render(false).contains("│ ┬"), underlined, "{}", error.render(false));
        }
    }

    #[test]
    fn a_span_within_a_letter_begins_at_the_letter() {
        for start in 8..11 {
            let error = SceneError::at("f", "a = 1\nä€ = 2", start..14, "no", "yes", "go");
            assert_eq!((error.location().as_str(), error.place.unwrap().span), ("f:2:2", 8..14));
        }
    }

    #[test]
    fn a_key_over_several_lines_is_refused_in_its_first() {
        let error = refuse("a = 1\n\"\"\"b\nc\"\"\" = 2\nd = 3\n");
        assert!(error.message.starts_with("this is not TOML: keys cannot be multi-line"), "{error}");
        assert_eq!(error.place.unwrap(), Place { line: 2, column: 1, span: 6..10 });
    }

    #[test]
    fn a_number_in_place_of_a_table_is_told_how_to_write_it() {
        for (text, help) in [
            (with("{ factor = 0.72 }", "0.72"), "write nose = { factor = 0.72 }"),
            ("projectile = 3".to_owned(), "write [projectile]"),
            ("impact = 3".to_owned(), "write [impact]"),
        ] {
            assert_eq!(refuse(&text).help, help, "{text}");
        }
    }

    #[test]
    fn a_misspelling_has_one_slip_in_three_letters_and_never_in_all() {
        for (text, known, likely) in [
            ("xyzdefghi", "abcdefghi", true),
            ("xyzwefghi", "abcdefghi", false),
            ("xycdefgh", "abcdefgh", true),
            ("xyzdefgh", "abcdefgh", false),
            ("xbcd", "abcd", true),
            ("xycd", "abcd", false),
            ("xb", "ab", true),
            ("xy", "ab", false),
            ("A", "a", true),
            ("x", "a", false),
            ("bacd", "abcd", true),
        ] {
            assert_eq!(nearest(text, &[known]), likely.then_some(known), "{text} for {known}");
        }
        assert_eq!(nearest("abd", &["xyz", "abc", "abde"]), Some("abc"));
        let long = "a".repeat(60);
        assert_eq!(nearest(&long, &[&long]), Some(long.as_str()));
        assert_eq!(nearest(&"a".repeat(61), &[&long]), None);
    }

    #[test]
    fn colours_appear_only_when_asked_for() {
        let error = refuse("");
        assert!(error.render(true).contains('\u{1b}') && !error.render(false).contains('\u{1b}'));
    }

    #[test]
    fn a_line_of_any_length_gives_a_short_message() {
        let long = format!("{} = 1", "x".repeat(100_000));
        let error = refuse(&long);
        assert!(error.render(false).len() < 1000, "{}", error.render(false));
        assert_eq!(error.location(), "scene.toml:1:1");
        let unit = with("50 mm", &format!("50 {}", "y".repeat(100_000)));
        assert!(refuse(&unit).render(false).len() < 1000);
    }

    proptest::proptest! {
        /// Any text gives a scene or an error that can be shown, never a panic.
        #[test]
        fn arbitrary_text_is_read_or_refused(text in ".{0,80}") {
            if let Err(error) = Scene::from_toml(&text, &text) {
                proptest::prop_assert!(!error.render(true).is_empty());
            }
        }

        /// So does a scene with any one piece replaced by any other text, and what is read resolves to finite numbers.
        #[test]
        fn a_mutilated_scene_is_read_or_refused(
            stages in proptest::bool::ANY,
            start in 0_usize..400,
            length in 0_usize..12,
            insert in "[-0-9a-z\\[\\]{}=\"'.,# \n\u{e4}\u{1b}]{0,6}",
        ) {
            let source = if stages { STAGES } else { FULL };
            let start = start.min(source.len());
            let end = (start + length).min(source.len());
            let text = [&source[..start], &insert, &source[end..]].concat();
            match Scene::from_toml(&text, "scene.toml") {
                Err(error) => {
                    let place = error.place.clone().unwrap();
                    proptest::prop_assert!(text.get(place.span).is_some());
                    proptest::prop_assert!(error.render(false).contains(&error.message));
                }
                Ok(scene) => {
                    if let Ok(problem) = scene.problem() {
                        for stage in &problem.stages {
                            let force = [stage.static_force, stage.stiffness, stage.viscosity, stage.drag];
                            proptest::prop_assert!(force.iter().all(|number| number.is_finite()));
                        }
                    }
                }
            }
        }
    }
}
