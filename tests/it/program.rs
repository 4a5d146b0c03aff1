//! The program as a test meets it: what it is given, and what it said.

#![allow(dead_code, reason = "each test binary uses its part")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// Exit code, standard output and standard error.
#[derive(Debug)]
pub(crate) struct Said {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        let code = output.status.code().unwrap_or_else(|| panic!("{output:?}"));
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        Self { code, out, err }
    }
}

impl Said {
    /// Standard error as one line: messages are broken at 80 columns.
    pub(crate) fn words(&self) -> String {
        self.err.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// This, if its exit code is `code`.
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, code, "{self:?}");
        self
    }

    /// [`Self::words`] of a refusal: exit code 2, and nothing on standard output.
    #[track_caller]
    pub(crate) fn refused(&self) -> String {
        assert_eq!((self.code, self.out.as_str()), (2, ""), "{self:?}");
        self.words()
    }
}

/// The words of a command line: blanks separate, single quotes hold together, and `@name` is the path of a shipped scene.
fn words(line: &str) -> Vec<String> {
    let pieces = line.split('\'').enumerate();
    let words = pieces.flat_map(|(i, piece)| if i % 2 == 1 { vec![piece] } else { piece.split_whitespace().collect() });
    words.map(|word| word.strip_prefix('@').map_or_else(|| word.to_owned(), scene)).collect()
}

/// The program in `folder`, with the arguments of `line`: see [`words`].
pub(crate) fn program(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penetrode"));
    command.args(words(line)).current_dir(folder);
    command
}

pub(crate) fn run_in(folder: &Path, line: &str) -> Said {
    program(folder, line).output().unwrap().into()
}

pub(crate) fn run(line: &str) -> Said {
    run_in(Path::new("."), line)
}

/// [`run`] with `input` on standard input.
pub(crate) fn run_with(input: &str, line: &str) -> Said {
    let mut command = program(Path::new("."), line);
    let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = piped.spawn().unwrap();
    // A program that refuses its options does not read.
    let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
    child.wait_with_output().unwrap().into()
}

/// What the program says with `--json`, whatever its exit code.
pub(crate) fn json(line: &str) -> Value {
    run(&format!("{line} --json")).json()
}

/// `value` is what the schema of `command` says: both are left for `tests/schemas.py`, which `.ci/run` runs behind the tests.
#[track_caller]
pub(crate) fn conforms(command: &str, value: &Value) {
    assert_eq!(value["schema"], format!("penetrode/{command}/1"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("answers").join(command);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("schema"), run(&format!("schema {command}")).expect(0).out).unwrap();
    let answer = value.to_string();
    fs::write(folder.join(format!("{}.json", blake3::hash(answer.as_bytes()))), answer).unwrap();
}

/// Path of a shipped scene.
pub(crate) fn scene(name: &str) -> String {
    format!("{}/verification/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// Names of what is in `folder`.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
