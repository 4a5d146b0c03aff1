//! How are small tables read whole: bounded, as text, refused with a remedy?

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::CliError;
use super::output::is_standard;

/// Largest table that is read whole [bytes]: a study of step sizes or a series of shots is some kilobytes.
const SIZE_MAX: u64 = 64 << 20;

/// Name of the table at `path` in messages.
pub fn input_name(path: &Path) -> String {
    if is_standard(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// The bytes of the table at `path`, `-` for standard input; `help` says what to name instead.
///
/// # Errors
/// A folder, a file that cannot be read, one of more than 64 MiB (exit 2).
pub fn table_bytes(path: &Path, help: &str) -> Result<Vec<u8>, CliError> {
    let refuse = |cause: &str| CliError::usage(format!("{} {cause}", input_name(path)), help);
    let unreadable = |error: io::Error| refuse(&format!("cannot be read: {error}"));
    let mut input: Box<dyn Read> = Box::new(io::stdin());
    if !is_standard(path) {
        if path.is_dir() {
            return Err(refuse("is a folder"));
        }
        let file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.len() > SIZE_MAX {
            return Err(refuse("is larger than 64 MiB, which no such table is"));
        }
        input = Box::new(file);
    }
    let mut bytes = Vec::new();
    // A pipe or a device has no length beforehand.
    input.take(SIZE_MAX + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > SIZE_MAX {
        return Err(refuse("is larger than 64 MiB, which no such table is"));
    }
    Ok(bytes)
}

/// The text of the table at `path`, in UTF-8.
///
/// # Errors
/// As [`table_bytes`], and bytes that are no text (exit 2).
pub fn table_text(path: &Path, help: &str) -> Result<String, CliError> {
    String::from_utf8(table_bytes(path, help)?).map_err(|error| {
        let start = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..start].split(|byte| *byte == b'\n').count();
        CliError::usage(format!("{}: line {line}: not UTF-8 text", input_name(path)), "save the table as CSV in UTF-8")
    })
}
