//! Studies: the answer that a command gives, to a program instead of a person.

use std::ffi::OsString;
use std::path::PathBuf;

use penetrode::cli::{self, CliError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::command_error;
use crate::scene::{Scene, loads};
use crate::{interruptible, pool};

/// What a command answered, and what it said on the way.
pub struct Answer {
    called: cli::Called,
    said: Vec<String>,
}

impl Answer {
    /// What `--json` prints.
    pub fn dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        loads(py, self.called.json.as_deref().unwrap_or("null"))
    }

    /// What is printed for people.
    pub fn text(&self) -> &str {
        &self.called.text
    }

    /// As Python takes it: data, text, exit code, what was said.
    pub fn parts<'py>(self, py: Python<'py>) -> PyResult<Parts<'py>> {
        Ok((self.dict(py)?, self.called.text, self.called.exit as u8, self.said))
    }
}

/// Data, text, exit code, what was said.
type Parts<'py> = (Bound<'py, PyAny>, String, u8, Vec<String>);

/// The answer to `words`, the command first and then its options; `scene` stands in front of the options. `files` are in memory.
pub fn answer(
    py: Python<'_>,
    mut words: Vec<String>,
    scene: Option<&Scene>,
    mut files: Vec<(String, Vec<u8>)>,
    class_of_usage: &str,
) -> PyResult<Answer> {
    if let Some(scene) = scene {
        let (named, file) = scene.inner.words();
        let place = words.iter().position(|word| word.starts_with("--")).unwrap_or(words.len());
        words.splice(place..place, named);
        files.push(file);
    }
    let threads = pool(py)?;
    let (called, said) = interruptible(py, move || threads.install(|| cli::call(&words, files)))?;
    let called = called.map_err(|error: CliError| command_error(py, class_of_usage, &error))?;
    Ok(Answer { called, said })
}

/// The answer of a command of penetrode.
///
/// Parameters
/// ----------
/// words : list of str
///     The command, and its options as in a shell.
/// scene : Scene, optional
///     Stands in front of the options.
/// files : list of (str, bytes)
///     Files that stand in memory, by the names in `words`.
/// fault : str
///     The exception for input at fault.
///
/// Returns
/// -------
/// tuple of (dict or None, str, int, list of str)
///     What ``--json`` prints, what is printed for people, the exit code, warnings and notes.
#[pyfunction]
#[pyo3(signature = (words, scene=None, files=Vec::new(), fault="OptionError"))]
pub fn call<'py>(
    py: Python<'py>,
    words: Vec<String>,
    scene: Option<&Bound<'py, Scene>>,
    files: Vec<(String, Bound<'py, PyBytes>)>,
    fault: &str,
) -> PyResult<Parts<'py>> {
    let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec())).collect();
    answer(py, words, scene.map(Bound::get), files, fault)?.parts(py)
}

/// From now on the program is at `path`, for claims about its commands.
#[pyfunction]
pub fn let_program_be(path: PathBuf) {
    cli::let_program_be(path);
}

/// Runs the program; returns its exit code.
///
/// Parameters
/// ----------
/// words : list of str
///     The command line, the program first.
/// program : os.PathLike
///     The program, for what runs it anew.
///
/// Returns
/// -------
/// int
#[pyfunction]
pub fn run(py: Python<'_>, words: Vec<OsString>, program: PathBuf) -> u8 {
    cli::let_program_be(program);
    py.detach(|| match cli::Cli::of_words(words) {
        Ok(cli) => cli.run() as u8,
        Err(error) => {
            // Help goes to standard output and a mistake to standard error, as the program does it.
            let _ = error.print();
            error.exit_code() as u8
        }
    })
}
