//! What does a program leave behind that is interrupted? Nothing: what it was making is removed, and its peers end with it.
//!
//! Files and folders that are made beside their place, to be moved there when they are whole, are [`Temporary`]. An
//! interrupt, a hang-up or a request to terminate removes those that are there, once [`clean_up_when_interrupted`] was
//! called. What must not be cut in two, such as the exchange of an old folder for a new one, is [`whole`].
//!
//! A program with nothing to remove and no peer has no handler: to start its thread takes a tenth of a short run.

use std::ops::{Deref, DerefMut};
use std::path::{self, Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{env, fs, io};

use tempfile::{NamedTempFile, TempDir};

/// Beginning of the names of temporary files and folders.
pub const PREFIX: &str = ".penetrode-";

/// Where the temporary files and folders are.
static MADE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Held while something happens that must not be cut in two.
static WHOLE: Mutex<()> = Mutex::new(());

/// Whether this program cleans up.
static CLEANS_UP: AtomicBool = AtomicBool::new(false);

fn lock<T>(mutex: &'static Mutex<T>) -> MutexGuard<'static, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file or a folder that is removed when it is dropped, and when the program is interrupted.
#[derive(Debug)]
pub struct Temporary<T> {
    // Dropped in this order: what is listed may be gone, what is there is listed.
    made: T,
    listed: Listed,
}

/// The entry of a path among those to be removed, as long as it lives.
#[derive(Debug)]
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        lock(&MADE).retain(|path| *path != self.0);
    }
}

impl<T> Temporary<T> {
    /// What `make` makes, which is at `path`.
    fn new(make: impl FnOnce() -> io::Result<T>, path: impl Fn(&T) -> &Path) -> io::Result<Self> {
        // Without a handler an interrupt leaves it behind, and no more.
        let _ = receive_signals();
        // Held while it is made, so that no interrupt falls between that and the entry.
        let mut list = lock(&MADE);
        let made = make()?;
        let listed = Listed(path(&made).to_owned());
        list.push(listed.0.clone());
        Ok(Self { made, listed })
    }

    /// What `finish` makes of it, such as moving it to its place.
    pub fn finish<R>(self, finish: impl FnOnce(T) -> R) -> R {
        let Self { made, listed } = self;
        let finished = finish(made);
        drop(listed);
        finished
    }
}

impl<T> Deref for Temporary<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.made
    }
}

impl<T> DerefMut for Temporary<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.made
    }
}

/// An empty file in `folder`.
///
/// # Errors
/// What the system says.
pub fn file_in(folder: &Path) -> io::Result<Temporary<NamedTempFile>> {
    Temporary::new(|| tempfile::Builder::new().prefix(PREFIX).tempfile_in(folder), NamedTempFile::path)
}

/// An empty folder in `place`.
///
/// # Errors
/// What the system says.
pub fn folder_in(place: &Path) -> io::Result<Temporary<TempDir>> {
    Temporary::new(|| tempfile::Builder::new().prefix(PREFIX).tempdir_in(place), TempDir::path)
}

/// An empty folder where the system has such; its path is absolute.
///
/// # Errors
/// What the system says.
pub fn folder() -> io::Result<Temporary<TempDir>> {
    folder_in(&path::absolute(env::temp_dir())?)
}

/// Writes `bytes` to the file `name` in `folder`, and makes the folders that `name` goes through.
///
/// `folder` itself is not made: an interruption of this program, or of the one that runs it, may have removed it.
///
/// # Errors
/// What the system says.
pub fn write_below(folder: &Path, name: &Path, bytes: &[u8]) -> io::Result<()> {
    let parts: Vec<_> = name.ancestors().skip(1).filter(|part| !part.as_os_str().is_empty()).collect();
    for part in parts.into_iter().rev() {
        fs::create_dir(folder.join(part)).or_else(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => Ok(()),
            _ => Err(error),
        })?;
    }
    fs::write(folder.join(name), bytes)
}

/// Does `step`, which no interruption cuts in two: it must end soon, and contain no other `whole` step.
pub fn whole<R>(step: impl FnOnce() -> R) -> R {
    let _held = lock(&WHOLE);
    step()
}

/// Lets an interrupt, a hang-up or a request to terminate remove what is temporary and end every peer before this program
/// ends.
///
/// For a program to call when it begins; a library leaves signals to its program. A signal that this program was told
/// to ignore, as by `nohup`, is ignored. Elsewhere than on Unix nothing happens.
pub fn clean_up_when_interrupted() {
    CLEANS_UP.store(true, Ordering::Relaxed);
}

/// Receives signals from now on, in a program that cleans up. To be called before there is anything to remove or to end.
///
/// # Errors
/// When the system allows no handler or no thread.
pub(in crate::exchange) fn receive_signals() -> io::Result<()> {
    #[cfg(unix)]
    if CLEANS_UP.load(Ordering::Relaxed) {
        unix::receive_signals()?;
    }
    Ok(())
}

#[cfg(unix)]
mod unix {
    use std::path::Path;
    use std::sync::Mutex;
    use std::time::Duration;
    use std::{fs, io, thread};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

    use super::{MADE, WHOLE, lock};
    use crate::exchange::peers::end_all;

    /// How often the removal of a folder is tried in which another process still writes, a millisecond apart.
    const TRIES_MAX: u32 = 2000;

    pub(super) fn receive_signals() -> io::Result<()> {
        static IS_DONE: Mutex<bool> = Mutex::new(false);
        let mut is_done = lock(&IS_DONE);
        if *is_done {
            return Ok(());
        }
        let ignored = ignored_signals();
        let heard = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| ignored & (1 << (signal - 1)) == 0);
        let mut signals = signal_hook::iterator::Signals::new(heard)?;
        let wait = move || {
            for signal in &mut signals {
                // All locked until the program has ended: nothing is made any more, and no peer starts.
                let _whole = lock(&WHOLE);
                let made = lock(&MADE);
                made.iter().for_each(|path| remove(path));
                let _running = end_all();
                let _ = signal_hook::low_level::emulate_default_handler(signal);
            }
        };
        thread::Builder::new().spawn(wait)?;
        *is_done = true;
        Ok(())
    }

    /// A bit for each signal that is ignored, from 1. Where the system does not say, `nohup` is taken to have been asked for.
    fn ignored_signals() -> u64 {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(1 << (SIGHUP - 1))
    }

    fn remove(path: &Path) {
        // Under another name at first, so that other threads, which go on, add nothing to a folder.
        let mut moved = path.as_os_str().to_owned();
        moved.push(".removed");
        let path = if fs::rename(path, &moved).is_ok() { Path::new(&moved) } else { path };
        for _ in 0..TRIES_MAX {
            let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            match removed {
                Err(error) if error.kind() != io::ErrorKind::NotFound => thread::sleep(Duration::from_millis(1)),
                _ => return,
            }
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a folder that cannot be made is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_was_removed_is_not_made_again_by_what_is_written_there() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("folder");
        assert_eq!(write_below(&folder, Path::new("a/b/c"), b"x").unwrap_err().kind(), io::ErrorKind::NotFound);
        assert!(!folder.exists());
        fs::create_dir(&folder).unwrap();
        for name in ["a/b/c", "a/d", "e"] {
            write_below(&folder, Path::new(name), name.as_bytes()).unwrap();
            assert_eq!(fs::read(folder.join(name)).unwrap(), name.as_bytes());
        }
    }
}
