//! The program itself, run as a person runs it: for claims about what its commands print.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use tempfile::TempDir;
use wait_timeout::ChildExt;

use super::claim::{Found, NotMeasured};
use crate::exchange::interruption::{self, Temporary};
use crate::exchange::scene_file::SHIPPED;

/// Longest run of a command that a claim asks for.
const TIME_MAX: Duration = Duration::from_secs(60);

/// Threads that wait for a run, for each that computes.
const WAITING: usize = 3;

/// The program with a folder of its own, which holds the shipped scenes as `NAME.toml` and what runs leave there.
#[derive(Debug)]
pub struct Program {
    path: PathBuf,
    folder: Temporary<TempDir>,
    waiting: ThreadPool,
}

/// What a run said.
#[derive(Clone, Debug)]
pub struct Said {
    /// Exit code; -1 after a signal.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Program {
    /// The program at `path`.
    ///
    /// # Errors
    /// The system refuses a temporary folder, or to write the scenes there.
    pub fn new(path: &Path) -> io::Result<Self> {
        let folder = interruption::folder()?;
        for (name, text) in SHIPPED {
            fs::write(folder.path().join(format!("{name}.toml")), text)?;
        }
        let threads = WAITING * rayon::current_num_threads();
        let waiting = ThreadPoolBuilder::new().num_threads(threads).build().map_err(io::Error::other)?;
        Ok(Self { path: path.to_owned(), folder, waiting })
    }

    /// What `runs` gives, in threads that wait for the program: more of them than there are processors.
    pub fn waiting<T: Send>(&self, runs: impl FnOnce() -> T + Send) -> T {
        self.waiting.install(runs)
    }

    /// The folder in which it runs.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Runs the program with the words of `line`, quoted as for a shell.
    ///
    /// # Errors
    /// [`NotMeasured`]: it cannot be started, does not end within a minute, or prints what is not UTF-8.
    pub fn run(&self, line: &str) -> Found<Said> {
        let words = shlex::split(line).ok_or_else(|| NotMeasured::broken(format!("no command line: {line}")))?;
        self.run_words(&words, self.folder())
            .map_err(|cause| NotMeasured::broken(format!("`penetrode {line}`: {cause}")))
    }

    /// Runs it as [`Self::run`] in an empty folder, to which the shipped scenes that `line` names and the `given` files go:
    /// also each file that it wrote there, by name.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_apart(&self, line: &str, given: &[(String, String)]) -> Found<(Said, Vec<(String, String)>)> {
        let words = shlex::split(line).ok_or_else(|| NotMeasured::broken(format!("no command line: {line}")))?;
        let apart = || {
            // Kept up to the end of all: some file systems are slow to make files where others were just removed.
            let folder = TempDir::new_in(self.folder())?.keep();
            let shipped = SHIPPED.iter().map(|(name, text)| (format!("{name}.toml"), *text));
            let given = given.iter().map(|(name, text)| (name.clone(), text.as_str()));
            let there: Vec<_> = shipped.filter(|(name, _)| words.contains(name)).chain(given).collect();
            for (name, text) in &there {
                interruption::write_below(&folder, Path::new(name), text.as_bytes())?;
            }
            let said = self.run_words(&words, &folder)?;
            let mut written = Vec::new();
            add_files(&folder, "", &mut written)?;
            written.retain(|(name, _)| !there.iter().any(|(given, _)| given == name));
            Ok((said, written))
        };
        apart().map_err(|cause: io::Error| NotMeasured::broken(format!("`penetrode {line}`: {cause}")))
    }

    fn run_words(&self, words: &[String], folder: &Path) -> io::Result<Said> {
        // Two files for each thread, written anew: to make and to remove files takes a good part of a short run.
        let thread = thread::current().id();
        let [out, err] = ["out", "err"].map(|name| self.folder.path().join(format!(".{thread:?}.{name}")));
        let mut child = Command::new(&self.path)
            .args(words)
            .current_dir(folder)
            .env("NO_COLOR", "1")
            // What a run leaves behind goes with the folder.
            .env("TMPDIR", self.folder())
            .stdin(Stdio::null())
            .stdout(File::create(&out)?)
            .stderr(File::create(&err)?)
            .spawn()?;
        // On Unix this takes SIGCHLD, and calls the handler that stood before.
        let Some(status) = child.wait_timeout(TIME_MAX)? else {
            child.kill()?;
            child.wait()?;
            return Err(io::Error::other(format!("does not end within {} s", TIME_MAX.as_secs())));
        };
        Ok(Said { code: status.code().unwrap_or(-1), out: fs::read_to_string(&out)?, err: fs::read_to_string(&err)? })
    }
}

impl Drop for Program {
    /// Several threads remove thousands of folders sooner than one; what is left goes with the folder that holds them.
    fn drop(&mut self) {
        let folders: Vec<_> = fs::read_dir(self.folder()).into_iter().flatten().flatten().collect();
        self.waiting(|| folders.par_iter().for_each(|folder| drop(fs::remove_dir_all(folder.path()))));
    }
}

/// Adds the text of every file in `folder`, in the order of their names behind `prefix`.
fn add_files(folder: &Path, prefix: &str, files: &mut Vec<(String, String)>) -> io::Result<()> {
    let mut entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            add_files(&entry.path(), &format!("{name}/"), files)?;
        } else {
            files.push((name, fs::read_to_string(entry.path())?));
        }
    }
    Ok(())
}
