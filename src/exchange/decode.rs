//! Which serde type does a TOML text describe, and how is the reader's error said in the words of the project?

use serde::Deserialize;
use toml::de::DeValue;

use super::diagnostic::{Dialect, Fault, key_of, parse, printable, type_of};
use crate::physics::units::QuantityError;

/// The `T` that the TOML `text` describes.
///
/// # Errors
/// [`Fault`]: the text is not TOML, or its tables, keys and types are not those of `T`.
pub(crate) fn decode<'t, T: Deserialize<'t>>(text: &'t str, dialect: &Dialect) -> Result<T, Fault> {
    T::deserialize(toml::Deserializer::from(parse(text)?)).map_err(|error| misplaced(text, &error, dialect))
}

/// Fault of a TOML text that is no `T`, by the `error` of its reader.
fn misplaced(text: &str, error: &toml::de::Error, dialect: &Dialect) -> Fault {
    let span = error.span().unwrap_or(0..0);
    let at = text.get(span.clone()).unwrap_or_default();
    let (message, shown) = (error.message(), error.to_string());
    let path = shown.trim_end().rsplit_once("\nin `").map_or("", |(_, path)| path.trim_end_matches('`'));
    let expected = message.rsplit_once("expected ").map_or("", |(_, expected)| expected);
    // The reader quotes the names that it expected.
    let known: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
    let word = at.trim_matches('"');
    if message.starts_with("unknown field") {
        dialect.unknown_key(path, span, word, &known)
    } else if message.starts_with("unknown variant") {
        dialect.unknown_word(path, span, word, &known)
    } else if let Some((_, known)) = message.split_once(", available keys: ") {
        dialect.unknown_key(path, span, word, &known.split(", ").collect::<Vec<_>>())
    } else if let Some(name) = message.strip_prefix("missing field `") {
        dialect.missing(path, span, name.trim_end_matches('`'), (dialect.remedy)(path))
    } else if message.starts_with("invalid type") {
        let wanted = match expected {
            _ if expected.starts_with("struct") => "a table",
            "a sequence" => "an array",
            "f64" => "a number",
            other => other,
        };
        // A header and a dotted key are no values; what they begin is a table.
        let found = DeValue::parse(at).map_or("a table", |value| type_of(value.get_ref()));
        dialect.mistyped(path, span, found, wanted)
    } else if message.ends_with("number overflowed") {
        let message = format!("`{}`: {}", key_of(path), QuantityError::NotFinite);
        Fault::new(span, message, "a finite number", "correct the number")
    } else {
        Fault::new(span, printable(message), format!("what {} takes", dialect.name_of(path)), (dialect.remedy)(path))
    }
}
