//! How are small tables read whole: bounded, as text, refused with a remedy?

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::CliError;

/// Largest table that is read whole [bytes]: a study of step sizes or a series of shots is some kilobytes.
const SIZE_MAX: u64 = 64 << 20;

/// The bytes of the table at `path`; `help` says what to name instead.
///
/// # Errors
/// A folder, a file that cannot be read, one of more than 64 MiB (exit 2).
pub fn table_bytes(path: &Path, help: &str) -> Result<Vec<u8>, CliError> {
    let refuse = |cause: &str| CliError::usage(format!("{} {cause}", path.display()), help);
    if path.is_dir() {
        return Err(refuse("is a folder"));
    }
    let mut bytes = Vec::new();
    let unreadable = |error: std::io::Error| refuse(&format!("cannot be read: {error}"));
    let file = File::open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > SIZE_MAX {
        return Err(refuse("is larger than 64 MiB, which no such table is"));
    }
    // A pipe or a device has no length beforehand.
    file.take(SIZE_MAX + 1).read_to_end(&mut bytes).map_err(unreadable)?;
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
        CliError::usage(format!("{}: line {line}: not UTF-8 text", path.display()), "save the table as CSV in UTF-8")
    })
}
