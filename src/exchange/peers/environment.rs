//! The peers that ship with the program, and the Python packages they need.
//!
//! The scripts are part of the binary and are written beside the virtual environment, so that an installed program
//! finds them anywhere. Both lie in a cache folder under a name that hashes their content: nothing is ever updated in
//! place, and an interrupted set-up leaves nothing behind that looks finished.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use std::{env, fs, io, thread};

use tempfile::TempDir;
use thiserror::Error;

use crate::exchange::interruption;
use crate::physics::Advice;

/// Environment variable that names the cache folder.
pub const CACHE_VARIABLE: &str = "PENETRODE_CACHE";
/// Environment variable that names the Python interpreter to start from; `python3` without it.
pub const PYTHON_VARIABLE: &str = "PENETRODE_PYTHON";

/// Longest time for one step of the set-up; a slow network needs minutes for the packages.
const STEP_LIMIT: Duration = Duration::from_secs(900);

const SCRIPTS: [(&str, &str); 4] = [
    ("heyoka_peer.py", include_str!("../../../verification/peers/heyoka_peer.py")),
    ("peer_protocol.py", include_str!("../../../verification/peers/peer_protocol.py")),
    ("scipy_peer.py", include_str!("../../../verification/peers/scipy_peer.py")),
    ("sundae_peer.py", include_str!("../../../verification/peers/sundae_peer.py")),
];
const REQUIREMENTS: &str = include_str!("../../../verification/peers/requirements.txt");
const REQUIREMENTS_HEYOKA: &str = include_str!("../../../verification/peers/requirements-heyoka.txt");

/// A peer that ships with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BundledPeer {
    /// scikit-sundae, CVODE with Adams methods: the cross-check.
    SundaeAdams,
    /// scikit-sundae, CVODE with BDF.
    SundaeBdf,
    /// scikit-sundae, IDA.
    SundaeIda,
    /// `solve_ivp` of scipy, RK45.
    Scipy,
    /// heyoka's adaptive Taylor integrator.
    Heyoka,
}

impl BundledPeer {
    /// Script and arguments.
    pub fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::SundaeAdams => &["sundae_peer.py", "--method", "adams"],
            Self::SundaeBdf => &["sundae_peer.py", "--method", "bdf"],
            Self::SundaeIda => &["sundae_peer.py", "--method", "ida"],
            Self::Scipy => &["scipy_peer.py"],
            Self::Heyoka => &["heyoka_peer.py"],
        }
    }

    /// The packages it needs, a line each, in the format of pip.
    pub fn requirements(self) -> &'static str {
        if self == Self::Heyoka { REQUIREMENTS_HEYOKA } else { REQUIREMENTS }
    }
}

/// Why the peers cannot be set up; each is a required program that is missing (exit code 5).
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PeerSetupError {
    /// No folder for the packages.
    #[error("no cache folder: set {CACHE_VARIABLE} to one")]
    NoCacheFolder,
    /// Python cannot be run, or is too old.
    #[error("the peers need Python 3.11 or later, and `{python}` {answer}")]
    NoPython {
        /// The program that was tried.
        python: String,
        /// What came of it.
        answer: String,
    },
    /// The `venv` module fails with this last line; some systems package it apart.
    #[error("Python cannot make a virtual environment (is its `venv` module installed?): {0}")]
    NoVirtualEnvironment(String),
    /// pip fails, mostly for want of a network, with this last line.
    #[error("the packages of the peers cannot be installed (is there a network?): {0}")]
    NoPackages(String),
    /// The cache folder cannot be written.
    #[error("cannot write `{path}`: {cause}")]
    Unwritable {
        /// Which file or folder.
        path: String,
        /// The system's reason.
        cause: String,
    },
}

impl Advice for PeerSetupError {
    fn is_missing(&self) -> bool {
        true
    }
}

/// Scripts and an interpreter that has their packages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// The interpreter of the virtual environment.
    pub python: PathBuf,
    /// Folder of the scripts.
    pub scripts: PathBuf,
}

impl Environment {
    /// The environment of `peer`, made now if it was not made before.
    ///
    /// `progress` gets a line at a time, for standard error, and none when everything is there already.
    ///
    /// # Errors
    /// [`PeerSetupError`]: no Python, no network, no place. Nothing half-made stays behind.
    pub fn ensure(peer: BundledPeer, progress: &mut dyn FnMut(&str)) -> Result<Self, PeerSetupError> {
        let cache = cache_folder(|name| env::var_os(name)).ok_or(PeerSetupError::NoCacheFolder)?;
        let python = env::var(PYTHON_VARIABLE).unwrap_or_else(|_| "python3".to_owned());
        Self::ensure_in(&cache, &python, peer.requirements(), progress)
    }

    /// [`Environment::ensure`] with everything given: cache folder, interpreter to start from, packages.
    ///
    /// # Errors
    /// As [`Environment::ensure`].
    pub fn ensure_in(
        cache: &Path,
        python: &str,
        requirements: &str,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Self, PeerSetupError> {
        let version = python_version(python)?;
        let texts = SCRIPTS.map(|(name, text)| format!("{name}\n{text}"));
        let scripts = published(cache, "scripts", &texts.each_ref().map(String::as_str), |folder| {
            SCRIPTS.iter().try_for_each(|(name, text)| {
                let path = folder.join(name);
                fs::write(&path, text).map_err(|error| unwritable(&path, &error))
            })
        })?;
        let folder = published(cache, "environment", &[python, &version, requirements], |folder| {
            progress(&format!("setting up the peers in {}", cache.display()));
            make_environment(folder, python, requirements, progress)
        })?;
        Ok(Self { python: interpreter(&folder), scripts })
    }

    /// The command of `peer` in this environment, quoted as [`super::Peer::start`] splits it.
    pub fn command(&self, peer: BundledPeer) -> String {
        let python = self.python.display().to_string();
        let [script, options @ ..] = peer.arguments() else { return python };
        let script = self.scripts.join(script).display().to_string();
        // -B: no compiled files beside the scripts, whose folder hashes its content.
        let words = [&python, "-B", &script].into_iter().chain(options.iter().copied());
        // A NUL cannot be quoted, and cannot be in a path either.
        shlex::try_join(words).unwrap_or_default()
    }
}

/// The cache folder, from the environment variables of the system.
fn cache_folder(variable: impl Fn(&str) -> Option<std::ffi::OsString>) -> Option<PathBuf> {
    let folder = |name: &str| variable(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    folder(CACHE_VARIABLE)
        .or_else(|| Some(folder("XDG_CACHE_HOME").filter(|path| path.is_absolute())?.join("penetrode")))
        .or_else(|| Some(folder("LOCALAPPDATA").filter(|_| cfg!(windows))?.join("penetrode")))
        .or_else(|| Some(folder("HOME")?.join(".cache").join("penetrode")))
}

/// The interpreter of a virtual environment.
fn interpreter(folder: &Path) -> PathBuf {
    folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" })
}

/// What `python` says its version is, if that is new enough.
fn python_version(python: &str) -> Result<String, PeerSetupError> {
    let refused = |answer| PeerSetupError::NoPython { python: python.to_owned(), answer };
    let output = Command::new(python)
        .arg("--version")
        .stdin(Stdio::null())
        .output()
        .map_err(|error| refused(format!("cannot be run: {error}")))?;
    let version = String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or("").trim().to_owned();
    let minor = version.strip_prefix("Python 3.").and_then(|rest| rest.split('.').next()?.parse::<u32>().ok());
    if output.status.success() && minor.is_some_and(|minor| minor >= 11) {
        Ok(version)
    } else {
        Err(refused(format!("says `{}`", version.chars().take(80).collect::<String>())))
    }
}

/// The folder `name-HASH` in `cache`, filled by `fill` if it is not there yet.
///
/// It is filled under another name and then renamed, so that it exists whole or not at all; when two programs do this
/// at once, the later finds it done and drops its own.
fn published(
    cache: &Path,
    name: &str,
    content: &[&str],
    fill: impl FnOnce(&Path) -> Result<(), PeerSetupError>,
) -> Result<PathBuf, PeerSetupError> {
    let mut hasher = blake3::Hasher::new();
    for part in content {
        // The length keeps parts apart that would join to the same text.
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
    }
    let folder = cache.join(format!("{name}-{}", &hasher.finalize().to_hex()[..16]));
    if folder.is_dir() {
        return Ok(folder);
    }
    fs::create_dir_all(cache).map_err(|error| unwritable(cache, &error))?;
    let draft = interruption::folder_in(cache).map_err(|error| unwritable(cache, &error))?;
    fill(draft.path())?;
    match fs::rename(draft.path(), &folder) {
        // Renamed: there is nothing left to delete.
        Ok(()) => drop(draft.finish(TempDir::keep)),
        Err(error) if !folder.is_dir() => return Err(unwritable(&folder, &error)),
        Err(_) => {}
    }
    Ok(folder)
}

fn unwritable(path: &Path, error: &io::Error) -> PeerSetupError {
    PeerSetupError::Unwritable { path: path.display().to_string(), cause: error.to_string() }
}

/// Makes a virtual environment with the packages in an empty folder.
fn make_environment(
    folder: &Path,
    python: &str,
    requirements: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<(), PeerSetupError> {
    let mut venv = Command::new(python);
    venv.args(["-m", "venv"]).arg(folder);
    run_to_end(venv, STEP_LIMIT, progress).map_err(PeerSetupError::NoVirtualEnvironment)?;
    let list = folder.join("requirements.txt");
    fs::write(&list, requirements).map_err(|error| unwritable(&list, &error))?;
    let mut pip = Command::new(interpreter(folder));
    // Wheels only: a missing compiler is one more way to fail late and at length.
    pip.args(["-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--progress-bar", "off"])
        .args(["--retries", "1", "--timeout", "20", "--only-binary", ":all:", "-r"])
        .arg(&list);
    run_to_end(pip, STEP_LIMIT, progress).map_err(PeerSetupError::NoPackages)
}

/// Runs a program within a time limit; its output goes to `progress` a line at a time. An error is its last line.
fn run_to_end(command: Command, limit: Duration, progress: &mut dyn FnMut(&str)) -> Result<(), String> {
    let deadline = Instant::now() + limit;
    let (output, mut child) = with_one_output(command).map_err(|error| error.to_string())?;
    let (send, lines) = channel();
    thread::spawn(move || {
        let lines = BufReader::new(output).split(b'\n').map_while(Result::ok);
        lines.map(|line| String::from_utf8_lossy(&line).trim().to_owned()).try_for_each(|line| send.send(line))
    });
    let mut last = String::new();
    loop {
        match lines.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(line) if line.is_empty() => {}
            Ok(line) => {
                progress(&line);
                if !line.starts_with("WARNING") {
                    last = line;
                }
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("not done after {} s", limit.as_secs()));
            }
        }
    }
    let status = child.wait().map_err(|error| error.to_string())?;
    match (status.success(), last.is_empty()) {
        (true, _) => Ok(()),
        (false, true) => Err(status.to_string()),
        (false, false) => Err(last),
    }
}

/// Starts a program whose standard output and standard error are one pipe. The command, which holds the other end of the
/// pipe, is dropped.
fn with_one_output(mut command: Command) -> io::Result<(io::PipeReader, Child)> {
    let (output, input) = io::pipe()?;
    let child = command.stdin(Stdio::null()).stdout(input.try_clone()?).stderr(input).spawn()?;
    Ok((output, child))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    // Its paths are those of Unix.
    #[cfg(unix)]
    #[test]
    fn the_cache_folder_is_the_first_that_the_system_names() {
        let folder = |given: &'static [(&str, &str)]| {
            cache_folder(|name| given.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).into()))
        };
        assert_eq!(folder(&[]), None);
        assert_eq!(folder(&[("HOME", "/h")]), Some("/h/.cache/penetrode".into()));
        assert_eq!(folder(&[("HOME", "/h"), ("XDG_CACHE_HOME", "/c")]), Some("/c/penetrode".into()));
        // The XDG specification: relative paths are invalid and to be ignored.
        assert_eq!(folder(&[("HOME", "/h"), ("XDG_CACHE_HOME", "c")]), Some("/h/.cache/penetrode".into()));
        assert_eq!(folder(&[("HOME", "/h"), (CACHE_VARIABLE, "here")]), Some("here".into()));
        assert_eq!(folder(&[("HOME", "/h"), (CACHE_VARIABLE, "")]), Some("/h/.cache/penetrode".into()));
    }

    #[test]
    fn a_folder_is_filled_once_and_its_name_hashes_its_content() {
        let cache = tempfile::tempdir().unwrap();
        let mut filled = 0;
        let mut publish = |content: &[&str]| {
            published(cache.path(), "thing", content, |folder| {
                filled += 1;
                fs::write(folder.join("file"), "text").map_err(|error| unwritable(folder, &error))
            })
            .unwrap()
        };
        let first = publish(&["ab", "c"]);
        assert_eq!(publish(&["ab", "c"]), first);
        assert_ne!(publish(&["a", "bc"]), first);
        assert_eq!(filled, 2);
        assert_eq!(fs::read_to_string(first.join("file")).unwrap(), "text");
    }

    #[test]
    fn an_interrupted_set_up_leaves_nothing() {
        let cache = tempfile::tempdir().unwrap();
        let failure = PeerSetupError::NoPackages("no route to host".to_owned());
        let error = published(cache.path(), "thing", &[], |folder| {
            fs::write(folder.join("half"), "").map_err(|error| unwritable(folder, &error))?;
            Err(failure.clone())
        });
        assert_eq!(error, Err(failure));
        assert_eq!(fs::read_dir(cache.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_missing_or_foreign_python_is_named() {
        let cache = tempfile::tempdir().unwrap();
        let ensure = |python| Environment::ensure_in(cache.path(), python, "", &mut |_| ()).unwrap_err();
        assert!(
            ensure("no-such-python")
                .to_string()
                .starts_with("the peers need Python 3.11 or later, and `no-such-python` cannot be run: ")
        );
        #[cfg(unix)]
        {
            let message = ensure("echo").to_string();
            assert!(message.starts_with("the peers need Python 3.11 or later, and `echo` says `"), "{message}");
            assert!(!message.contains('\n'), "{message}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_program_that_fails_is_reported_with_its_last_words_and_one_that_hangs_is_ended() {
        let run = |script: &str, limit: Duration| {
            let mut heard = Vec::new();
            let mut command = Command::new("sh");
            command.args(["-c", script]);
            let done = run_to_end(command, limit, &mut |line| heard.push(line.to_owned()));
            (done, heard)
        };
        let minute = Duration::from_secs(60);
        assert_eq!(run("echo one; sleep 0.2; echo two >&2", minute), (Ok(()), vec!["one".into(), "two".into()]));
        assert_eq!(run("echo out; echo ERROR: no route >&2; exit 1", minute).0, Err("ERROR: no route".into()));
        assert_eq!(run("exit 3", minute).0, Err("exit status: 3".into()));
        let (done, _) = run("exec sleep 60", Duration::from_millis(200));
        assert_eq!(done, Err("not done after 0 s".into()));
    }

    #[cfg(unix)]
    #[test]
    fn a_command_survives_spaces_in_its_paths() {
        let environment = Environment { python: "/a b/python".into(), scripts: "/c'd".into() };
        let command = environment.command(BundledPeer::SundaeBdf);
        let words = shlex::split(&command).unwrap();
        assert_eq!(words, ["/a b/python", "-B", "/c'd/sundae_peer.py", "--method", "bdf"]);
    }

    #[test]
    fn every_package_is_pinned() {
        use BundledPeer::{Heyoka, Scipy, SundaeAdams, SundaeBdf, SundaeIda};
        for peer in [SundaeAdams, SundaeBdf, SundaeIda, Scipy, Heyoka] {
            let packages: Vec<_> = peer.requirements().lines().filter(|line| !line.starts_with('#')).collect();
            assert!(!packages.is_empty() && packages.iter().all(|line| line.contains("==")), "{packages:?}");
            assert!(SCRIPTS.iter().any(|(name, _)| *name == peer.arguments()[0]));
        }
    }
}
