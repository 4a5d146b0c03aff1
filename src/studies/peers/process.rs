//! A peer as a child process that may die, hang, babble or print megabytes.
//!
//! Its three pipes are served by a thread each, so that no full pipe can block the asker; every wait has a time limit,
//! every line and buffer a size. A peer that breaks the protocol is ended at once, named, and not asked again.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{io, thread};

use serde::Deserialize;
use serde_json::{Value, json};
use thiserror::Error;

use super::wire::{EventJson, PeerAnswer, PeerRequest, outcome_from_name};
use crate::physics::Outcome;

/// Exit code by which a peer says, before its greeting, that a program it needs is missing.
pub const EXIT_CODE_MISSING: i32 = 5;

/// Characters of an answer that a failure quotes.
const QUOTED_CHARS: usize = 200;
/// Characters of a name, version or method that a peer may give itself.
const NAME_CHARS: usize = 120;
/// How long a peer that closed its output may take to end, and its last words to arrive.
const GRACE: Duration = Duration::from_millis(500);

/// What is allowed to a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeerLimits {
    /// Longest wait for one answer.
    pub silence: Duration,
    /// Longest line of an answer [bytes].
    pub line_bytes: usize,
    /// Standard error kept [bytes]; the end is kept, where the cause is.
    pub stderr_bytes: usize,
}

impl Default for PeerLimits {
    fn default() -> Self {
        Self { silence: Duration::from_secs(30), line_bytes: 1 << 20, stderr_bytes: 64 << 10 }
    }
}

/// Who a peer says it is; control characters are replaced and lengths bounded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PeerIdentity {
    /// Name of the program.
    pub name: String,
    /// Its version; empty when it gives none.
    pub version: String,
    /// Its method; empty when it gives none.
    pub method: String,
}

impl std::fmt::Display for PeerIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name)?;
        [&self.version, &self.method]
            .into_iter()
            .filter(|part| !part.is_empty())
            .try_for_each(|part| write!(f, " {part}"))
    }
}

/// What a peer did instead of answering.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PeerFault {
    /// It answered that it cannot fly this; other questions may follow.
    #[error("reports an error: {message}")]
    Reported {
        /// Its words, bounded.
        message: String,
    },
    /// It ended, or closed its output.
    #[error("ended without an answer ({status})")]
    Died {
        /// Exit status in words.
        status: String,
    },
    /// No line within the time limit.
    #[error("was silent for {} s", silence.as_secs_f64())]
    Silent {
        /// The time limit.
        silence: Duration,
    },
    /// A line that is no answer to the question.
    #[error("answers nonsense: {why}")]
    Nonsense {
        /// What is wrong with it.
        why: String,
    },
}

/// A question without an answer, with everything a report needs.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{peer} {fault}{}{}", quote("; it printed ", printed), quote("; on standard error ", &last_line(stderr)))]
pub struct PeerFailure {
    /// Name of the peer, or its command before the greeting.
    pub peer: String,
    /// What happened.
    pub fault: PeerFault,
    /// What it printed in place of an answer, escaped and bounded; may be empty.
    pub printed: String,
    /// The end of its standard error, control characters replaced; may be empty.
    pub stderr: String,
}

impl PeerFailure {
    /// Whether the peer may be asked something else: it kept the protocol and only could not fly this.
    pub fn is_reported(&self) -> bool {
        matches!(self.fault, PeerFault::Reported { .. })
    }
}

/// Why there is no peer to ask.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PeerStartError {
    /// The command line names no program: a mistake of the caller, exit code 2.
    #[error("`{command}` is not a command: {why}")]
    Command {
        /// As given.
        command: String,
        /// What is wrong.
        why: &'static str,
    },
    /// The program cannot be started, exit code 5.
    #[error("`{command}` cannot be started: {cause}")]
    CannotStart {
        /// As given.
        command: String,
        /// The system's reason.
        cause: String,
    },
    /// The peer says that something it needs is missing, exit code 5.
    #[error("`{command}` lacks what it needs: {said}")]
    Missing {
        /// As given.
        command: String,
        /// The last line of its standard error.
        said: String,
    },
    /// It started and did not greet: a failed peer like any other.
    #[error(transparent)]
    Greeting(#[from] PeerFailure),
}

impl PeerStartError {
    /// Whether a required program is missing (exit code 5).
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::CannotStart { .. } | Self::Missing { .. })
    }

    /// Whether the request was at fault (exit code 2).
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Command { .. })
    }
}

/// What the reading thread heard on standard output.
enum Heard {
    /// A line, or what came before the end of the output.
    Line(Vec<u8>),
    /// The beginning of a line that went on beyond the limit.
    TooLong(Vec<u8>),
    /// The output ended.
    End,
}

/// A running peer that has greeted. Dropped, it is killed.
#[derive(Debug)]
pub struct Peer {
    identity: PeerIdentity,
    command: String,
    line: Line,
    questions_asked: u64,
    failure: Option<PeerFailure>,
}

/// The child process and the channels of its threads.
struct Line {
    child: Child,
    /// Lines for its standard input.
    to_peer: Sender<Vec<u8>>,
    from_peer: Receiver<Heard>,
    stderr: Arc<Mutex<Vec<u8>>>,
    /// Disconnects when standard error has ended.
    stderr_ended: Receiver<()>,
    limits: PeerLimits,
}

impl std::fmt::Debug for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Line").field("child", &self.child.id()).field("limits", &self.limits).finish_non_exhaustive()
    }
}

impl Peer {
    /// Starts `command` (split as a shell would, run without one) and waits for its greeting.
    ///
    /// # Errors
    /// [`PeerStartError`]: no command, no such program, something it needs is missing, or no greeting.
    pub fn start(command: &str) -> Result<Self, PeerStartError> {
        Self::start_within(command, PeerLimits::default())
    }

    /// [`Peer::start`] with limits other than the usual.
    ///
    /// # Errors
    /// As [`Peer::start`].
    pub fn start_within(command: &str, limits: PeerLimits) -> Result<Self, PeerStartError> {
        let refuse = |why| PeerStartError::Command { command: command.to_owned(), why };
        let words = shlex::split(command).ok_or_else(|| refuse("a quote is not closed"))?;
        let (program, arguments) = words.split_first().ok_or_else(|| refuse("it is empty"))?;
        let mut line = Line::open(Command::new(program).args(arguments), limits)
            .map_err(|error| PeerStartError::CannotStart { command: command.to_owned(), cause: error.to_string() })?;
        match line.exchange(&json!({"hello": 1})).and_then(|answer| greeting(&answer)) {
            Ok(identity) => Ok(Self { identity, command: command.to_owned(), line, questions_asked: 0, failure: None }),
            Err(lapse) => {
                let status = line.end();
                let failure = lapse.into_failure(&format!("`{command}`"), &line);
                let missing = status.is_some_and(|status| status.code() == Some(EXIT_CODE_MISSING));
                if missing && matches!(failure.fault, PeerFault::Died { .. }) {
                    let said = last_line(&failure.stderr);
                    return Err(PeerStartError::Missing { command: command.to_owned(), said });
                }
                Err(failure.into())
            }
        }
    }

    /// Who the peer says it is.
    pub fn identity(&self) -> &PeerIdentity {
        &self.identity
    }

    /// The command it was started with.
    pub fn command(&self) -> &str {
        &self.command
    }

    /// The end of what it wrote on standard error so far, control characters replaced.
    pub fn stderr(&self) -> String {
        self.line.stderr_text()
    }

    /// Asks for one flight and waits for the answer.
    ///
    /// # Errors
    /// [`PeerFailure`]. Unless the peer itself reports an error, it is ended, and each later question gets the same
    /// failure without being asked.
    pub fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        self.questions_asked += 1;
        let mut question = json!(request);
        question["id"] = json!(self.questions_asked);
        let answer = self.line.exchange(&question).and_then(|line| answer(&line, self.questions_asked, request));
        answer.map_err(|lapse| {
            let reported = matches!(lapse.fault, PeerFault::Reported { .. });
            if !reported {
                self.line.end();
            }
            let failure = lapse.into_failure(&self.identity.to_string(), &self.line);
            if !reported {
                self.failure = Some(failure.clone());
            }
            failure
        })
    }
}

/// A fault and what was printed, before it is known who and with which standard error.
struct Lapse {
    fault: PeerFault,
    printed: String,
}

impl Lapse {
    /// The reason may repeat what was printed, so it is bounded and escaped too.
    fn nonsense(why: &str, printed: &[u8]) -> Self {
        Self { fault: PeerFault::Nonsense { why: excerpt(why.as_bytes()) }, printed: excerpt(printed) }
    }

    fn into_failure(self, peer: &str, line: &Line) -> PeerFailure {
        PeerFailure { peer: peer.to_owned(), fault: self.fault, printed: self.printed, stderr: line.stderr_text() }
    }
}

impl Line {
    fn open(command: &mut Command, limits: PeerLimits) -> io::Result<Self> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (to_peer, questions) = channel();
        // One line of look-ahead: a peer that floods its output waits in its own pipe.
        let (heard, from_peer) = sync_channel(1);
        let (alive, stderr_ended) = channel();
        let stderr = Arc::new(Mutex::new(Vec::new()));
        let line = Self { child, to_peer, from_peer, stderr: Arc::clone(&stderr), stderr_ended, limits };
        let (Some(input), Some(output), Some(complaints)) = pipes else {
            return Err(io::Error::other("a pipe to the peer is missing"));
        };
        // The threads are not joined: a grandchild may keep a pipe open for as long as it likes.
        thread::Builder::new().spawn(move || write_lines(input, &questions))?;
        thread::Builder::new().spawn(move || read_lines(output, &heard, limits.line_bytes))?;
        thread::Builder::new().spawn(move || keep_tail(complaints, &stderr, limits.stderr_bytes, &alive))?;
        Ok(line)
    }

    /// Sends one object and waits for one line.
    fn exchange(&mut self, question: &Value) -> Result<Vec<u8>, Lapse> {
        // A writer that is gone means a peer that is gone, which the reader reports.
        let _ = self.to_peer.send(format!("{question}\n").into_bytes());
        let fault = match self.from_peer.recv_timeout(self.limits.silence) {
            Ok(Heard::Line(line)) => return Ok(line),
            Ok(Heard::TooLong(start)) => {
                return Err(Lapse::nonsense(&format!("a line longer than {} bytes", self.limits.line_bytes), &start));
            }
            Ok(Heard::End) | Err(RecvTimeoutError::Disconnected) => PeerFault::Died { status: self.status_in_words() },
            Err(RecvTimeoutError::Timeout) => PeerFault::Silent { silence: self.limits.silence },
        };
        Err(Lapse { fault, printed: String::new() })
    }

    /// How a peer without output has ended.
    fn status_in_words(&mut self) -> String {
        let deadline = Instant::now() + GRACE;
        while Instant::now() < deadline {
            match self.child.try_wait() {
                Ok(Some(status)) => return status.to_string(),
                Ok(None) => thread::sleep(Duration::from_millis(5)),
                Err(error) => return error.to_string(),
            }
        }
        "it closed its output and runs on".to_owned()
    }

    /// Ends the process, if it still runs, and lets its last words arrive.
    fn end(&mut self) -> Option<ExitStatus> {
        // Errors here mean that it is gone already.
        let _ = self.child.kill();
        let status = self.child.wait().ok();
        let _ = self.stderr_ended.recv_timeout(GRACE);
        status
    }

    fn stderr_text(&self) -> String {
        let kept = self.stderr.lock().unwrap_or_else(PoisonError::into_inner);
        printable(&String::from_utf8_lossy(&kept))
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Writes questions until the asker or the peer is gone.
fn write_lines(mut input: ChildStdin, questions: &Receiver<Vec<u8>>) {
    for question in questions {
        if input.write_all(&question).and_then(|()| input.flush()).is_err() {
            return;
        }
    }
}

/// Passes lines on until the asker is gone, the output ends, or a line is too long.
fn read_lines(output: ChildStdout, heard: &SyncSender<Heard>, line_bytes: usize) {
    let mut output = BufReader::new(output);
    loop {
        let mut line = Vec::new();
        let what = match output.by_ref().take(line_bytes as u64 + 1).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => Heard::End,
            Ok(_) if line.len() > line_bytes => Heard::TooLong(line),
            Ok(_) => Heard::Line(line),
        };
        let last = !matches!(what, Heard::Line(_));
        if heard.send(what).is_err() || last {
            return;
        }
    }
}

/// Reads standard error to its end and keeps the last `limit` bytes. `_alive` is dropped at the end.
fn keep_tail(mut complaints: ChildStderr, kept: &Mutex<Vec<u8>>, limit: usize, _alive: &Sender<()>) {
    let mut chunk = [0; 4096];
    while let Ok(count @ 1..) = complaints.read(&mut chunk) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(&chunk[..count]);
        let excess = kept.len().saturating_sub(limit);
        kept.drain(..excess);
    }
}

/// Reads the greeting.
fn greeting(line: &[u8]) -> Result<PeerIdentity, Lapse> {
    #[derive(Deserialize)]
    struct Greeting {
        name: String,
        #[serde(default)]
        version: String,
        #[serde(default)]
        method: String,
    }
    let Greeting { name, version, method } =
        serde_json::from_slice(line).map_err(|error| Lapse::nonsense(&format!("no greeting ({error})"), line))?;
    if name.trim().is_empty() {
        return Err(Lapse::nonsense("a greeting without a name", line));
    }
    let [name, version, method] =
        [name, version, method].map(|text| escaped(&text.chars().take(NAME_CHARS).collect::<String>()));
    Ok(PeerIdentity { name, version, method })
}

/// Reads the answer to question number `id`.
fn answer(line: &[u8], id: u64, request: &PeerRequest) -> Result<PeerAnswer, Lapse> {
    #[derive(Deserialize)]
    struct Answer {
        id: Value,
        outcome: Option<String>,
        depth_m: Option<f64>,
        time_s: Option<f64>,
        velocity_m_s: Option<f64>,
        #[serde(default)]
        events: Option<Vec<EventJson>>,
        force_evaluations: Option<u64>,
        wall_ns: Option<f64>,
        wall_ns_quartiles: Option<[f64; 2]>,
        error: Option<String>,
    }
    let nonsense = |why: String| Lapse::nonsense(&why, line);
    // NaN and Infinity are no tokens of JSON and 1e400 is no number of f64: both fail here.
    let answer: Answer = serde_json::from_slice(line).map_err(|error| nonsense(error.to_string()))?;
    if answer.id != json!(id) {
        return Err(nonsense(format!("it answers question {} and was asked question {id}", answer.id)));
    }
    if let Some(message) = answer.error {
        let message = excerpt(message.as_bytes());
        return Err(Lapse { fault: PeerFault::Reported { message }, printed: String::new() });
    }
    let number = |value: Option<f64>, name: &str| value.ok_or_else(|| nonsense(format!("no `{name}` and no `error`")));
    let (depth_m, time_s) = (number(answer.depth_m, "depth_m")?, number(answer.time_s, "time_s")?);
    let outcome = match answer.outcome {
        Some(name) => outcome_from_name(&name).ok_or_else(|| nonsense(format!("no outcome is called {name:?}")))?,
        None => outcome_of_depth(depth_m, request),
    };
    Ok(PeerAnswer {
        outcome,
        depth_m,
        time_s,
        velocity_m_s: number(answer.velocity_m_s, "velocity_m_s")?,
        events: answer.events.unwrap_or_default(),
        force_evaluations: answer.force_evaluations,
        wall_ns: answer.wall_ns,
        wall_ns_quartiles: answer.wall_ns_quartiles,
    })
}

/// The outcome that a depth means when the peer names none: perforated where the exit depth is reached within the
/// tolerance asked for.
fn outcome_of_depth(depth: f64, request: &PeerRequest) -> Outcome {
    match request.exit_depth_m {
        Some(exit) if exit - depth <= (request.rtol * exit).max(request.atol[0]) => Outcome::Perforated,
        _ => Outcome::Stopped,
    }
}

/// The beginning of what was printed, on one line and harmless on a terminal.
fn excerpt(printed: &[u8]) -> String {
    let start = &printed[..printed.len().min(4 * QUOTED_CHARS)];
    let text = String::from_utf8_lossy(start);
    let text = text.trim_end();
    let mut quoted = escaped(&text.chars().take(QUOTED_CHARS).collect::<String>());
    if printed.len() > start.len() || text.chars().count() > QUOTED_CHARS {
        quoted.push('…');
    }
    quoted
}

/// Control characters as escapes, everything else as it is.
fn escaped(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

/// Several lines, harmless on a terminal.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{FFFD}' } else { c }).collect()
}

/// The last line that says something.
/// The last line of `text` that is not blank, bounded: a peer may write a line of megabytes.
fn last_line(text: &str) -> String {
    let line = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("");
    let mut bounded: String = line.chars().take(QUOTED_CHARS).collect();
    if line.chars().nth(QUOTED_CHARS).is_some() {
        bounded.push('…');
    }
    bounded
}

/// `text` in quotes after `before`, or nothing when there is none.
fn quote(before: &str, text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("{before}`{text}`") }
}

#[cfg(all(test, unix))]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;
    use crate::studies::peers::wire::StageJson;

    const GREETING: &str = r#"read q; echo '{"name": "fake", "version": "1", "method": "none"}'"#;
    const ANSWER: &str = r#"{"id": 1, "outcome": "stopped", "depth_m": 0.5, "time_s": 2e-3, "velocity_m_s": 0}"#;

    fn sh(script: &str) -> String {
        format!("sh -c {}", shlex::try_quote(script).unwrap())
    }

    fn request() -> PeerRequest {
        let stage =
            StageJson { static_force_n: 1.0, stiffness_n_m: 0.0, viscosity_kg_s: 0.0, drag_kg_m: 0.0, end_m: None };
        PeerRequest {
            mass_kg: 1.0,
            velocity_m_s: 1.0,
            exit_depth_m: None,
            rtol: 1e-9,
            atol: [1e-9, 1e-9],
            repeats: 1,
            stages: vec![stage],
        }
    }

    /// A peer that greets and then does `script`; the first question is in its pipe.
    fn peer(script: &str) -> Peer {
        peer_within(script, PeerLimits::default())
    }

    fn peer_within(script: &str, limits: PeerLimits) -> Peer {
        Peer::start_within(&sh(&format!("{GREETING}; {script}")), limits).unwrap()
    }

    /// The failure of a peer that prints `line` as its answer.
    fn failure_of_answer(line: &str) -> PeerFailure {
        peer(&format!("read q; printf '%b\\n' {}; sleep 5", shlex::try_quote(line).unwrap()))
            .ask(&request())
            .unwrap_err()
    }

    fn nonsense_of_answer(line: &str) -> String {
        match failure_of_answer(line).fault {
            PeerFault::Nonsense { why } => why,
            fault => unreachable!("{fault}"),
        }
    }

    #[test]
    fn an_answer_is_heard_to_the_last_digit() {
        let mut peer = peer(&format!("read q; echo '{}'; read q", ANSWER.replace("0.5", "0.1448262001122170665")));
        assert_eq!(peer.identity().to_string(), "fake 1 none");
        let answer = peer.ask(&request()).unwrap();
        assert_eq!(answer.outcome, Outcome::Stopped);
        assert_eq!((answer.depth_m, answer.time_s, answer.velocity_m_s), (0.144_826_200_112_217_06, 2e-3, 0.0));
        assert_eq!((answer.events.len(), answer.force_evaluations, answer.wall_ns), (0, None, None));
    }

    #[test]
    fn a_question_carries_its_number_and_every_field_of_the_contract() {
        let mut peer = peer(r#"read q; echo "$q" >&2; read q"#);
        let limits = PeerLimits { silence: Duration::from_millis(500), ..PeerLimits::default() };
        peer.line.limits = limits;
        let failure = peer.ask(&request()).unwrap_err();
        let question: Value = serde_json::from_str(failure.stderr.lines().last().unwrap()).unwrap();
        let stage = json!({"static_force_n": 1.0, "stiffness_n_m": 0.0, "viscosity_kg_s": 0.0, "drag_kg_m": 0.0, "end_m": null});
        let wanted = json!({"id": 1, "mass_kg": 1.0, "velocity_m_s": 1.0, "exit_depth_m": null, "rtol": 1e-9,
            "atol": [1e-9, 1e-9], "repeats": 1, "stages": [stage]});
        assert_eq!(question, wanted);
    }

    #[test]
    fn a_missing_outcome_follows_from_the_depth() {
        let answer = ANSWER.replace(r#""outcome": "stopped", "#, "");
        for (exit_depth_m, outcome) in
            [(None, Outcome::Stopped), (Some(0.6), Outcome::Stopped), (Some(0.5 + 1e-10), Outcome::Perforated)]
        {
            let request = PeerRequest { exit_depth_m, ..request() };
            let answer = peer(&format!("read q; echo '{answer}'; read q")).ask(&request).unwrap();
            assert_eq!(answer.outcome, outcome, "exit depth {exit_depth_m:?}");
        }
    }

    #[test]
    fn a_peer_that_dies_is_named_with_its_status_and_last_words_and_not_asked_again() {
        let mut peer = peer("read q; echo 'matrix is singular' >&2; exit 7");
        let failure = peer.ask(&request()).unwrap_err();
        assert_eq!(
            failure.to_string(),
            "fake 1 none ended without an answer (exit status: 7); on standard error `matrix is singular`"
        );
        assert_eq!(peer.ask(&request()).unwrap_err(), failure);
        assert_eq!(peer.questions_asked, 1);
    }

    #[test]
    fn a_peer_that_hangs_is_ended_after_the_time_limit_and_not_asked_again() {
        let limits = PeerLimits { silence: Duration::from_millis(400), ..PeerLimits::default() };
        let mut peer = peer_within("exec sleep 60", limits);
        let started = Instant::now();
        let failure = peer.ask(&request()).unwrap_err();
        assert_eq!(failure.to_string(), "fake 1 none was silent for 0.4 s");
        assert_eq!(peer.ask(&request()).unwrap_err(), failure);
        assert!(started.elapsed() < Duration::from_secs(20), "{:?}", started.elapsed());
        assert!(peer.line.child.try_wait().unwrap().is_some(), "the peer still runs");
    }

    #[test]
    fn a_peer_that_closes_its_output_and_runs_on_has_died() {
        let failure = peer("read q; exec 1>&-; exec sleep 60").ask(&request()).unwrap_err();
        let PeerFault::Died { status } = &failure.fault else { unreachable!("{failure}") };
        assert_eq!(status, "it closed its output and runs on");
    }

    #[test]
    fn nonsense_is_quoted() {
        let failure = failure_of_answer("Loading solver ... done");
        assert!(
            failure
                .to_string()
                .starts_with("fake 1 none answers nonsense: expected value at line 1 column 1; it printed `Loading")
        );
        assert!(nonsense_of_answer("").contains("EOF"));
        let event = r#"{"event": "\\033[31m", "time_s": 0, "depth_m": 0, "velocity_m_s": 0}"#;
        let why = nonsense_of_answer(&format!(r#"{{"id": 1, "events": [{event}]}}"#));
        assert!(!why.chars().any(char::is_control), "{why:?}");
        let long = ANSWER.replace("0.5", &format!("{:?}", "x".repeat(100_000)));
        assert_eq!(nonsense_of_answer(&long).chars().count(), QUOTED_CHARS + 1);
        assert!(nonsense_of_answer("[1, 2]").contains("expected"));
        assert!(nonsense_of_answer(&ANSWER.replace("0.5", r#""half a metre""#)).contains("invalid type"));
        assert!(nonsense_of_answer(&"[".repeat(5000)).contains("line 1"));
    }

    #[test]
    fn an_answer_to_another_question_is_nonsense() {
        assert_eq!(
            nonsense_of_answer(&ANSWER.replace(r#""id": 1"#, r#""id": 2"#)),
            "it answers question 2 and was asked question 1"
        );
        assert!(nonsense_of_answer(&ANSWER.replace(r#""id": 1"#, r#""id": "1""#)).contains("question \"1\""));
        assert!(nonsense_of_answer(&ANSWER.replace(r#""id": 1, "#, "")).contains("missing field `id`"));
    }

    #[test]
    fn not_a_number_is_no_answer() {
        for token in ["NaN", "Infinity", "-Infinity", "nan", "1e400", "-1e400"] {
            let why = nonsense_of_answer(&ANSWER.replace("0.5", token));
            // All are refused where they stand, in whatever words.
            assert!(why.contains(" at line 1 column "), "{token}: {why}");
        }
        assert_eq!(nonsense_of_answer(&ANSWER.replace("0.5", "null")), "no `depth_m` and no `error`");
        assert_eq!(nonsense_of_answer(r#"{"id": 1}"#), "no `depth_m` and no `error`");
    }

    #[test]
    fn an_unknown_outcome_is_nonsense() {
        assert_eq!(nonsense_of_answer(&ANSWER.replace("stopped", "vaporised")), "no outcome is called \"vaporised\"");
    }

    #[test]
    fn megabytes_without_a_line_end_are_cut_off() {
        let failure = peer("read q; yes | tr -d '\\n'").ask(&request()).unwrap_err();
        let PeerFault::Nonsense { why } = &failure.fault else { unreachable!("{failure}") };
        assert_eq!(why, "a line longer than 1048576 bytes");
        assert_eq!(failure.printed.chars().count(), QUOTED_CHARS + 1);
    }

    #[test]
    fn megabytes_of_lines_are_nonsense_at_the_first() {
        let failure = peer("read q; yes").ask(&request()).unwrap_err();
        assert_eq!(failure.printed, "y");
    }

    #[test]
    fn megabytes_on_standard_error_block_nothing_and_only_the_end_is_kept() {
        let flood = "head -c 3000000 /dev/zero | tr '\\0' x >&2; echo >&2; echo the end >&2";
        let mut peer = peer(&format!("read q; {flood}; echo '{ANSWER}'; exit 0"));
        peer.ask(&request()).unwrap();
        let failure = peer.ask(&request()).unwrap_err();
        assert_eq!(failure.stderr.len(), PeerLimits::default().stderr_bytes);
        assert_eq!(last_line(&failure.stderr), "the end");
    }

    #[test]
    fn a_peer_that_does_not_read_a_long_question_is_silent_and_blocks_nothing() {
        let limits = PeerLimits { silence: Duration::from_millis(400), ..PeerLimits::default() };
        let mut peer = peer_within("exec sleep 60", limits);
        let long = PeerRequest { stages: vec![request().stages[0]; 20_000], ..request() };
        assert!(matches!(peer.ask(&long).unwrap_err().fault, PeerFault::Silent { .. }));
    }

    #[test]
    fn a_grandchild_that_keeps_the_pipes_open_blocks_nothing() {
        let started = Instant::now();
        let mut peer = peer("read q; sleep 8 & exit 3");
        let limits = PeerLimits { silence: Duration::from_millis(400), ..PeerLimits::default() };
        peer.line.limits = limits;
        assert!(peer.ask(&request()).is_err());
        drop(peer);
        assert!(started.elapsed() < Duration::from_secs(7), "{:?}", started.elapsed());
    }

    #[test]
    fn a_reported_error_is_no_fault_and_the_next_question_is_asked() {
        let second = ANSWER.replace(r#""id": 1"#, r#""id": 2"#);
        let mut peer = peer(&format!(
            r#"read q; echo '{{"id": 1, "error": "root \u001b[31m found"}}'; read q; echo '{second}'; read q"#
        ));
        let failure = peer.ask(&request()).unwrap_err();
        assert!(failure.is_reported());
        assert_eq!(failure.to_string(), r"fake 1 none reports an error: root \u{1b}[31m found");
        assert_eq!(peer.ask(&request()).unwrap().depth_m, 0.5);
    }

    #[test]
    fn what_a_peer_prints_cannot_drive_a_terminal() {
        let failure = failure_of_answer(r"\033[2Jgone \0377 \0007");
        assert!(!failure.to_string().chars().any(char::is_control), "{failure:?}");
        let peer = Peer::start(&sh(r#"read q; echo '{"name": "\u001b[2J"}'; echo "a\033[2Jb" >&2; read q"#)).unwrap();
        assert_eq!(peer.identity().name, r"\u{1b}[2J");
    }

    #[test]
    fn a_program_that_is_not_there_is_missing_and_a_bad_command_is_usage() {
        let error = Peer::start("no-such-program-anywhere --flag").unwrap_err();
        assert!(error.is_missing() && !error.is_usage(), "{error}");
        assert!(error.to_string().starts_with("`no-such-program-anywhere --flag` cannot be started: "));
        for command in ["", "   ", "python3 'peer.py"] {
            let error = Peer::start(command).unwrap_err();
            assert!(error.is_usage() && !error.is_missing(), "{error}");
        }
    }

    #[test]
    fn exit_code_5_before_the_greeting_says_that_something_is_missing() {
        let error = Peer::start(&sh("echo 'scikit-sundae is not installed' >&2; exit 5")).unwrap_err();
        assert!(error.is_missing());
        assert!(error.to_string().ends_with("lacks what it needs: scikit-sundae is not installed"), "{error}");
        let error = Peer::start(&sh("exit 4")).unwrap_err();
        assert!(!error.is_missing() && !error.is_usage());
        assert_eq!(error.to_string(), "`sh -c 'exit 4'` ended without an answer (exit status: 4)");
    }

    #[test]
    fn a_greeting_without_a_name_is_nonsense() {
        for greeting in [r#"{"name": "  "}"#, r#"{"version": "1"}"#, "hello"] {
            let error = Peer::start(&sh(&format!("read q; echo '{greeting}'; read q"))).unwrap_err();
            let PeerStartError::Greeting(failure) = &error else { unreachable!("{error}") };
            assert!(matches!(failure.fault, PeerFault::Nonsense { .. }), "{failure}");
        }
    }

    #[test]
    fn a_dropped_peer_is_dead() {
        let peer = peer("exec sleep 60");
        let pid = peer.line.child.id().to_string();
        drop(peer);
        let alive = Command::new("kill").args(["-0", &pid]).stderr(Stdio::null()).status().unwrap();
        assert!(!alive.success(), "process {pid} lives");
    }
}
