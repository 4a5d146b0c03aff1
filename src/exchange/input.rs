//! How is a file read that a person names: whole and up to a size, or as it comes? `-` is standard input.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use thiserror::Error;

/// Why a file is not read.
#[derive(Debug, Error)]
pub enum Unread {
    /// A folder.
    #[error("is a folder")]
    Folder,
    /// More bytes than such a file has.
    #[error("is too large")]
    TooLarge,
    /// The system refuses.
    #[error(transparent)]
    System(#[from] io::Error),
}

/// Whether `path` stands for standard input or output.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Name of the input at `path` in messages.
pub fn name_of(path: &Path) -> String {
    if is_standard(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// Opens the file at `path`; `None` for standard input.
///
/// # Errors
/// [`Unread`]: a folder, or what the system says.
pub fn open(path: &Path) -> Result<Option<File>, Unread> {
    match path {
        _ if is_standard(path) => Ok(None),
        _ if path.is_dir() => Err(Unread::Folder),
        _ => Ok(Some(File::open(path)?)),
    }
}

/// What the file at `path` holds.
///
/// # Errors
/// [`Unread`]: as [`open`], or more than `most` bytes.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, Unread> {
    let input: Box<dyn Read> = match open(path)? {
        None => Box::new(io::stdin()),
        Some(file) if file.metadata()?.len() > most => return Err(Unread::TooLarge),
        Some(file) => Box::new(file),
    };
    let mut bytes = Vec::new();
    // A pipe or a device has no length beforehand.
    input.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(Unread::TooLarge) } else { Ok(bytes) }
}
