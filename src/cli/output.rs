//! How results leave the program: JSON, numbers for people, tables, and files written whole or not at all.

use std::cell::RefCell;
use std::ffi::{OsStr, OsString};
use std::fmt::Display;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use tempfile::NamedTempFile;

use super::CliError;
use crate::exchange::input::is_standard;
use crate::exchange::interruption::{self, Temporary};
use crate::report::figure::Figure;
pub use crate::text::{engineering, error_text, harmless as escape_terminal, significant};

/// Prints `value` as pretty JSON on standard output.
///
/// # Errors
/// When standard output cannot be written; a closed pipe is not an error.
pub fn print_json<T: Serialize>(value: &T) -> io::Result<()> {
    let mut text = serde_json::to_string_pretty(value).map_err(io::Error::other)?;
    text.push('\n');
    print_text(&text)
}

/// Prints `text` on standard output; a reader that has gone away (`| head`) is not an error.
///
/// # Errors
/// When standard output cannot be written for another reason.
pub fn print_text(text: &str) -> io::Result<()> {
    unless_closed(io::stdout().lock().write_all(text.as_bytes()).and_then(|()| io::stdout().flush()))
}

/// `result`, a reader of the pipe that has gone away being no error.
///
/// # Errors
/// Any other error of `result`.
pub fn unless_closed(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// Width of what is printed for people (characters).
pub const WIDTH: usize = 80;

/// `text` in lines of [`WIDTH`] at most, behind `head`; further lines are indented by as much as `head` is long.
///
/// A word that is longer than a line stays whole: a path is copied, not read.
pub fn wrapped(head: &str, text: &str) -> String {
    let indent = head.chars().count();
    let lines = crate::text::wrapped(text, WIDTH.saturating_sub(indent));
    format!("{head}{}", lines.join(&format!("\n{}", " ".repeat(indent))))
}

/// Whether nothing but errors is said on standard error.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// From now on nothing but errors is said on standard error.
pub fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

thread_local! {
    /// What was said to a program that listens, in place of standard error.
    static HEARD: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

/// What `work` gives, and what it said meanwhile (warnings, notes), none of it on standard error.
///
/// Of this thread alone.
pub fn hearing<R>(work: impl FnOnce() -> R) -> (R, Vec<String>) {
    HEARD.set(Some(Vec::new()));
    let made = work();
    (made, HEARD.take().unwrap_or_default())
}

/// Prints for a person on standard error, `head` (`warning: `) in front, unless all is to be quiet.
pub fn say(head: &str, text: &str) {
    let is_heard = HEARD.with_borrow_mut(|heard| heard.as_mut().map(|heard| heard.push(format!("{head}{text}"))));
    if is_heard.is_none() {
        say_line(&wrapped(head, text));
    }
}

/// A line as it is on standard error, unless all is to be quiet.
pub fn say_line(line: &str) {
    if !IS_QUIET.load(Ordering::Relaxed) {
        say_error(line);
    }
}

/// A line as it is on standard error. Where it is closed the work goes on.
pub fn say_error(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Whether both paths are one file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    !is_standard(a) && (a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b))
}

/// A file of a run and what it is, for messages: `("the scene", path)`.
pub type Named<'a> = (&'static str, &'a Path);

/// Refuses `outputs`, before any work is done, that would replace an input or one another, or have no folder to go to.
///
/// # Errors
/// A file that would be replaced, or that is none, such as a device; the name of a scene or a suite; a folder that is
/// missing, or in the place of a file (exit 2). A folder in which the system allows no new file (exit 1).
pub fn check_outputs(inputs: &[Named<'_>], outputs: &[Named<'_>]) -> Result<(), CliError> {
    for (index, (what, path)) in outputs.iter().enumerate() {
        let others = inputs.iter().chain(&outputs[..index]);
        if let Some((other, _)) = others.into_iter().find(|(_, other)| is_same_file(other, path)) {
            let help = match index {
                0 => "name another file",
                _ => "name the table .csv: a figure goes beside it, with the ending .svg",
            };
            return Err(CliError::usage(format!("{what} would replace {other}: both are {}", path.display()), help));
        }
        if is_standard(path) {
            continue;
        }
        let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
        if is_toml {
            let message = format!("{what} cannot go to {}: such a file is a scene or a suite", path.display());
            return Err(CliError::usage(message, "name a file with another ending, such as .csv"));
        }
        check_place(what, path)?;
    }
    Ok(())
}

/// Refuses `path`, which is not standard output, for `what` where no file can be written.
///
/// # Errors
/// As [`check_outputs`].
pub fn check_place(what: &str, path: &Path) -> Result<(), CliError> {
    if let Some((why, help)) = obstacle(path) {
        return Err(CliError::usage(format!("{what} cannot go to {}: {why}", path.display()), help));
    }
    // What the system refuses is known by trying alone; the file of the trial vanishes.
    Destination::open(path).map(drop).map_err(|cause| CliError::write(path, cause))
}

/// Why no file can be written at `path`, as far as is known before trying, and what to do.
fn obstacle(path: &Path) -> Option<(String, &'static str)> {
    if path.is_dir() {
        return Some(("it is a folder".to_owned(), "name a file in it"));
    }
    if fs::symlink_metadata(path).is_ok() && !path.is_file() {
        return Some(("it is a device, a pipe or a broken link".to_owned(), "name a file, or - for standard output"));
    }
    let folder = path.parent().filter(|folder| !(folder.as_os_str().is_empty() || folder.is_dir()))?;
    Some(if folder.exists() {
        (format!("{} is a file", folder.display()), "name a folder")
    } else {
        (format!("there is no folder {}", folder.display()), "make the folder first, or name another")
    })
}

/// Where the figures beside the table at `path` go, one for each ending of its name; none beside standard output.
pub fn figure_paths(path: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let stem = path.file_stem().filter(|_| !is_standard(path));
    let name =
        |stem: &OsStr, ending: &&str| [stem, OsStr::new(ending), OsStr::new(".svg")].into_iter().collect::<OsString>();
    stem.map_or(Vec::new(), |stem| endings.iter().map(|ending| path.with_file_name(name(stem, ending))).collect())
}

/// [`check_outputs`] of the table at `out`, if one is asked for, and of the figures beside it.
///
/// # Errors
/// As [`check_outputs`].
pub fn check_table(inputs: &[Named<'_>], out: Option<&Path>, endings: &[&str]) -> Result<(), CliError> {
    let Some(out) = out else { return Ok(()) };
    let figures = figure_paths(out, endings);
    let outputs = figures.iter().map(|path| ("the figure", path.as_path()));
    check_outputs(inputs, &[("the table", out)].into_iter().chain(outputs).collect::<Vec<_>>())
}

/// Writes the table to `path` and the figures beside it, as [`write_all`] does; a figure without a point is left out.
///
/// # Errors
/// As [`write_all`].
pub fn write_table(
    path: &Path,
    table: io::Result<Vec<u8>>,
    endings: &[&str],
    figures: impl IntoIterator<Item = Option<Figure>>,
) -> Result<(), CliError> {
    let mut files = vec![(path.to_owned(), table.map_err(|cause| CliError::write(path, cause))?)];
    for (path, figure) in figure_paths(path, endings).into_iter().zip(figures) {
        match figure {
            Some(figure) => files.push((path, figure.file().into_bytes())),
            // A sweep of bad rows has a table, and nothing to draw.
            None => say("warning: ", &format!("{} not written: no point in its range", path.display())),
        }
    }
    write_all(&files)
}

/// Writes `files`, all of them whole or none: each into a temporary file beside its place, then all moved into place.
///
/// A path `-` is standard output.
///
/// # Errors
/// When a folder cannot be written or the disk is full; the old files are then untouched.
pub fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<(), CliError> {
    let mut written = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        let write = || {
            let mut output = Destination::open(path)?;
            // What does not fit on the disk is known here, before the first file is replaced.
            unless_closed(output.write_all(bytes).and_then(|()| output.flush()))?;
            Ok(output)
        };
        written.push((path, write().map_err(|cause| CliError::write(path, cause))?));
    }
    // Table and figures together.
    interruption::whole(|| {
        written
            .into_iter()
            .try_for_each(|(path, output)| output.finish(path).map_err(|cause| CliError::write(path, cause)))
    })
}

/// The file itself where `path` is a link to it, which stays.
fn followed(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// Where a table goes: standard output, or a file that appears when it is whole.
#[derive(Debug)]
pub enum Destination {
    /// Standard output.
    Standard(io::Stdout),
    /// A temporary file.
    File(Temporary<NamedTempFile>),
}

impl Destination {
    /// The destination at `path`, `-` being standard output.
    ///
    /// # Errors
    /// When the folder cannot be written, or `path` names a folder.
    pub fn open(path: &Path) -> io::Result<Self> {
        if is_standard(path) {
            return Ok(Self::Standard(io::stdout()));
        }
        if path.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        let path = followed(path);
        let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        interruption::file_in(folder).map(Self::File)
    }

    /// Lets the file appear at `path`, with the permissions that an ordinary new file has.
    ///
    /// # Errors
    /// When the disk is full or the move fails; a reader that has gone away is no error.
    pub fn finish(mut self, path: &Path) -> io::Result<()> {
        unless_closed(self.flush())?;
        let Self::File(file) = self else { return Ok(()) };
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // A temporary file is private; a result is for everybody whom the old one was for.
            let mode = fs::metadata(path).map_or(0o644, |m| m.permissions().mode());
            fs::set_permissions(file.path(), fs::Permissions::from_mode(mode))?;
        }
        file.finish(|file| file.persist(followed(path))).map(|_| ()).map_err(|e| e.error)
    }
}

impl Write for Destination {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Standard(output) => output.write(bytes),
            Self::File(file) => file.write(bytes),
        }
    }

    /// Also to the disk.
    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Standard(output) => output.flush(),
            Self::File(file) => file.as_file().sync_all(),
        }
    }
}

/// What to do about a file that cannot be written.
pub fn write_help(kind: io::ErrorKind) -> &'static str {
    use io::ErrorKind::{
        IsADirectory, NotADirectory, NotFound, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull,
    };
    match kind {
        NotFound => "make the folder first, or name another",
        IsADirectory => "that is a folder: name a file in it",
        NotADirectory => "a part of this path is a file: name a folder",
        PermissionDenied | ReadOnlyFilesystem => "name a place where you may write",
        StorageFull | QuotaExceeded => "make room on the disk, or name another; what was there is untouched",
        _ => "name another place; what was there is untouched",
    }
}

/// Whether the table at `path` is a Parquet table, by its name.
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"))
}

/// Refuses a Parquet table in a build that does without them (exit 2).
///
/// # Errors
/// As said.
pub fn check_format(path: &Path) -> Result<(), CliError> {
    if cfg!(feature = "parquet") || !is_parquet(path) {
        return Ok(());
    }
    Err(CliError::usage(
        format!("{}: this build reads and writes CSV only", path.display()),
        "build with `--features parquet`, or name a .csv file",
    ))
}

/// `1.92 .. 2.07`, or a dash.
pub fn interval_text(interval: Option<[f64; 2]>) -> String {
    interval.map_or("-".to_owned(), |[low, high]| format!("{low:.2} .. {high:.2}"))
}

/// A table without a frame, so that it copies well.
pub fn table(header: &[&str]) -> comfy_table::Table {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(header.iter().copied());
    // Where a number of a strange scene makes a row too wide, its cells wrap. The indent takes one column, and the
    // padding of the last cell is cut off.
    table.set_content_arrangement(comfy_table::ContentArrangement::Dynamic).set_width(WIDTH as u16);
    table
}

/// Text for people, made line by line.
#[derive(Debug, Default)]
pub struct Text(String);

impl Text {
    /// Text that begins with `title`, where there is one.
    pub fn titled(title: Option<&str>) -> Self {
        let mut text = Self::default();
        text.lines(title.map(escape_terminal));
        text
    }

    /// Adds a line as it is.
    pub fn line(&mut self, line: impl Display) {
        self.0.push_str(&format!("{line}\n"));
    }

    /// Adds each of `lines`.
    pub fn lines(&mut self, lines: impl IntoIterator<Item = impl Display>) {
        lines.into_iter().for_each(|line| self.line(line));
    }

    /// Begins a part with `line`, an empty line in front of it unless it is the first.
    pub fn part(&mut self, line: impl Display) {
        if !self.0.is_empty() {
            self.gap();
        }
        self.line(line);
    }

    /// Adds an empty line.
    pub fn gap(&mut self) {
        self.line("");
    }

    /// Adds `text` behind `head`, in lines that are not too long.
    pub fn wrapped(&mut self, head: &str, text: &str) {
        self.line(wrapped(head, text));
    }

    /// Adds a table, indented by two.
    pub fn table(&mut self, header: &[&str], rows: impl IntoIterator<Item = impl Into<comfy_table::Row>>) {
        let mut table = table(header);
        table.add_rows(rows);
        self.lines(table_lines(&table));
    }

    /// What was added.
    pub fn finish(self) -> String {
        self.0
    }
}

/// The lines of a table, indented by two, without blanks at their ends.
pub fn table_lines(table: &comfy_table::Table) -> Vec<String> {
    // The style pads each cell by one blank.
    table.to_string().lines().map(|line| format!(" {line}").trim_end().to_owned()).collect()
}

/// A bar without a length yet; it shows on a terminal only, and not where all is to be quiet.
pub fn new_progress() -> ProgressBar {
    let bar = ProgressBar::no_length();
    if IS_QUIET.load(Ordering::Relaxed) {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

/// Gives `bar` a length and a look, by the `template` of a [`ProgressStyle`].
pub fn show_progress(bar: &ProgressBar, length: u64, template: &str) {
    bar.set_length(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}
