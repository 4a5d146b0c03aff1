//! How is a file read that a person names: whole and up to a size, or as it comes? `-` is standard input.
//!
//! A program that calls a command in place of a person may hold a file in memory ([`holding`]).

use std::cell::RefCell;
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

thread_local! {
    /// Files in memory, by their names.
    static HELD: RefCell<Vec<(String, Vec<u8>)>> = const { RefCell::new(Vec::new()) };
}

/// Does `work`, for which a file of each of the names stands in memory; only files that are read whole do.
///
/// Of this thread alone, and until `work` ends.
pub fn holding<R>(files: Vec<(String, Vec<u8>)>, work: impl FnOnce() -> R) -> R {
    /// Puts back what was held before, also where `work` panics.
    struct Before(Vec<(String, Vec<u8>)>);
    impl Drop for Before {
        fn drop(&mut self) {
            HELD.replace(std::mem::take(&mut self.0));
        }
    }
    let _before = Before(HELD.replace(files));
    work()
}

/// The file in memory of the name `path`.
fn held(path: &Path) -> Option<Vec<u8>> {
    let name = path.to_str()?;
    HELD.with_borrow(|files| files.iter().find(|(held, _)| held == name).map(|(_, bytes)| bytes.clone()))
}

/// Whether there is a file at `path`, in memory or not.
pub fn is_file(path: &Path) -> bool {
    held(path).is_some() || path.exists() && !path.is_dir()
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
    if let Some(bytes) = held(path) {
        return if bytes.len() as u64 > most { Err(Unread::TooLarge) } else { Ok(bytes) };
    }
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

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    #[test]
    fn a_file_in_memory_is_read_by_its_name_until_the_work_ends() {
        let path = Path::new("in-memory.toml");
        let files = vec![("in-memory.toml".to_owned(), b"text".to_vec())];
        assert_eq!(holding(files, || read(path, 4).unwrap()), b"text");
        assert!(read(path, 4).is_err());
        let too_large = holding(vec![("in-memory.toml".to_owned(), b"text".to_vec())], || read(path, 3));
        assert!(matches!(too_large, Err(Unread::TooLarge)));
    }
}
