//! A peer as a child process that may die, hang, babble or print megabytes.
//!
//! Its three pipes are served by a thread each, so that no full pipe can block the asker; every wait has a time limit,
//! every line and buffer a size. A peer that breaks the protocol is ended at once, named, and not asked again.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{io, thread};

use serde::Deserialize;
use serde_json::{Value, json};
use thiserror::Error;

use self::group::Group;
use super::wire::{PeerAnswer, PeerRequest};
use crate::exchange::diagnostic::printable;
use crate::physics::Advice;
use crate::text::clipped;

mod group;

#[cfg(unix)]
pub(in crate::exchange) use self::group::end_all;

/// Exit code by which a peer says, before its greeting, that a program it needs is missing.
pub const EXIT_CODE_MISSING: i32 = 5;

/// Characters of an answer that a failure quotes.
const QUOTED_CHARS: usize = 200;
/// Characters of a name, version or method that a peer may give itself.
const NAME_CHARS: usize = 120;
/// How long a peer that closed its output may take to end, and its last words to arrive.
const GRACE: Duration = Duration::from_millis(500);

/// Longest wait for one answer.
const SILENCE: Duration = Duration::from_secs(30);
/// Longest line of an answer (bytes).
const LINE_BYTES: usize = 1 << 20;
/// Standard error stored (bytes): its end, where the cause is.
const STDERR_BYTES: usize = 64 << 10;

/// Who a peer says it is; control characters are replaced and lengths bounded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PeerIdentity {
    /// Name of the program.
    pub name: String,
    /// Its version; empty when it gives none.
    pub version: String,
    /// Its method; empty when it gives none.
    pub method: String,
    /// Whether it takes fixed steps: it is given the step, and a tolerance means nothing to it.
    pub fixed_step: bool,
    /// Whether it answers from the physical scene in place of the stages.
    pub reads_scene: bool,
    /// Orders of convergence that it claims, by quantity ([`ORDER_QUANTITIES`]), or one for all of them ([`ORDER_OF_ALL`]).
    pub claimed_orders: BTreeMap<String, f64>,
}

/// Key of an order that is claimed for every quantity.
pub const ORDER_OF_ALL: &str = "all";

/// Quantities whose order a peer may claim, by name.
pub const ORDER_QUANTITIES: [&str; 5] = ["depth", "time", "velocity", "crater_end_time", "crater_end_velocity"];

/// The answer to `hello`, as it stands on the line.
#[derive(Deserialize)]
struct Greeting {
    name: String,
    version: Option<String>,
    method: Option<String>,
    fixed_step: Option<bool>,
    reads: Option<Reads>,
    order: Option<Value>,
}

/// What a peer reads, where it says so.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Reads {
    Scene,
}

impl std::fmt::Display for PeerIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let parts = [&self.name, &self.version, &self.method].into_iter().filter(|part| !part.is_empty());
        f.write_str(&parts.map(String::as_str).collect::<Vec<_>>().join(" "))
    }
}

/// What a peer did instead of answering.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PeerFault {
    /// It answered that it cannot solve this, in these words, bounded; other questions may follow.
    #[error("reports an error: {0}")]
    Reported(String),
    /// It ended, or closed its output; with this exit status in words.
    #[error("ended without an answer ({0})")]
    Died(String),
    /// No line within this time limit.
    #[error("was silent for {} s", .0.as_secs_f64())]
    Silent(Duration),
    /// A line that is no answer to the question.
    #[error("answers nonsense: {why}{}", quote("; it printed ", printed))]
    Nonsense {
        /// What is wrong with it, bounded: the reason may repeat what was printed.
        why: String,
        /// What it printed in place of an answer, escaped and bounded; may be empty.
        printed: String,
    },
}

impl PeerFault {
    fn nonsense(why: &str, printed: &[u8]) -> Self {
        Self::Nonsense { why: excerpt(why.as_bytes()), printed: excerpt(printed) }
    }
}

/// A question without an answer, with everything a report needs.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{peer} {fault}{}", quote("; on standard error ", &last_line(stderr)))]
pub struct PeerFailure {
    /// Name of the peer, or its command before the greeting.
    pub peer: String,
    /// What happened.
    pub fault: PeerFault,
    /// The end of its standard error, control characters replaced; may be empty.
    pub stderr: String,
}

impl PeerFailure {
    /// Whether the peer may be asked something else: it followed the protocol and only could not solve this.
    pub fn is_reported(&self) -> bool {
        matches!(self.fault, PeerFault::Reported(_))
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
    /// The program, or something it needs, is missing, or it ended before it greeted: exit code 5.
    #[error("`{command}` {why}")]
    Missing {
        /// As given.
        command: String,
        /// The system's reason, or the last line of its standard error.
        why: String,
    },
    /// It takes fixed steps, or reads the physical scene, where stages are to be solved to a tolerance: exit code 2.
    #[error("`{command}` {why}, and here it would be asked for stages and a tolerance")]
    Unfit {
        /// As given.
        command: String,
        /// What its greeting says.
        why: &'static str,
    },
    /// It started and did not greet: a failed peer like any other.
    #[error(transparent)]
    Greeting(#[from] PeerFailure),
}

impl Advice for PeerStartError {
    fn is_missing(&self) -> bool {
        matches!(self, Self::Missing { .. })
    }

    fn is_usage(&self) -> bool {
        matches!(self, Self::Command { .. } | Self::Unfit { .. })
    }

    fn help(&self) -> String {
        match self {
            Self::Command { .. } => "give a program and its arguments, quoted as for a shell".to_owned(),
            Self::Missing { .. } => String::new(),
            Self::Unfit { .. } => "`penetrode diagnose` asks it what it can answer".to_owned(),
            Self::Greeting(_) => "see the peer protocol: verification/peers/README.md".to_owned(),
        }
    }
}

/// A running peer that has greeted. Dropped, it is killed, and what it started with it.
#[derive(Debug)]
pub struct Peer {
    identity: PeerIdentity,
    command: String,
    line: Line,
    questions_asked: u64,
    failure: Option<PeerFailure>,
}

/// The child process and the channels of its threads.
#[derive(Debug)]
struct Line {
    child: Child,
    group: Group,
    /// Lines for its standard input.
    to_peer: Sender<Vec<u8>>,
    /// Lines of its standard output, the last of them cut off if it is too long; disconnects when that has ended.
    from_peer: Receiver<Vec<u8>>,
    stderr: Arc<Mutex<Vec<u8>>>,
    /// Disconnects when standard error has ended.
    stderr_ended: Receiver<()>,
    /// Longest wait for one answer.
    silence: Duration,
}

impl Peer {
    /// Starts `command` (split as a shell would, run without one) and waits for its greeting.
    ///
    /// # Errors
    /// [`PeerStartError`]: no command, no such program, something it needs is missing, or no greeting.
    pub fn start(command: &str) -> Result<Self, PeerStartError> {
        Self::start_within(command, SILENCE)
    }

    /// [`Peer::start`] of a peer that solves stages to a tolerance.
    ///
    /// # Errors
    /// As [`Peer::start`], and [`PeerStartError::Unfit`] for a peer of another kind.
    pub fn start_adaptive(command: &str) -> Result<Self, PeerStartError> {
        let peer = Self::start(command)?;
        let why = match peer.identity {
            PeerIdentity { fixed_step: true, .. } => "takes fixed steps",
            PeerIdentity { reads_scene: true, .. } => "reads the physical scene",
            _ => return Ok(peer),
        };
        Err(PeerStartError::Unfit { command: command.to_owned(), why })
    }

    /// [`Peer::start`] with `silence` as the longest wait for one answer.
    ///
    /// # Errors
    /// As [`Peer::start`].
    pub fn start_within(command: &str, silence: Duration) -> Result<Self, PeerStartError> {
        let refuse = |why| PeerStartError::Command { command: command.to_owned(), why };
        let missing = |why| PeerStartError::Missing { command: command.to_owned(), why };
        let words = shlex::split(command).ok_or_else(|| refuse("a quote is not closed"))?;
        let (program, arguments) = words.split_first().ok_or_else(|| refuse("it is empty"))?;
        let mut line = Line::open(Command::new(program).args(arguments), silence)
            .map_err(|error| missing(format!("cannot be started: {error}")))?;
        match line.exchange(&json!({"hello": 1})).and_then(|answer| greeting(&answer)) {
            Ok(identity) => Ok(Self { identity, command: command.to_owned(), line, questions_asked: 0, failure: None }),
            Err(fault) => {
                let code = line.end().and_then(|status| status.code());
                let failure = PeerFailure { peer: format!("`{command}`"), fault, stderr: line.stderr_text() };
                let last_words = last_line(&failure.stderr);
                Err(match failure.fault {
                    PeerFault::Died(_) if code == Some(EXIT_CODE_MISSING) => {
                        missing(format!("lacks what it needs: {last_words}"))
                    }
                    PeerFault::Died(status) => {
                        let said = quote("; on standard error ", &last_words);
                        missing(format!("ended before it greeted ({status}){said}"))
                    }
                    _ => failure.into(),
                })
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

    /// Asks for one flight and waits for the answer.
    ///
    /// # Errors
    /// [`PeerFailure`]. Unless the peer itself reports an error, it is ended, and each later question gets the same
    /// failure without being asked.
    pub fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        self.ask_judging(request, true)
    }

    /// As [`Peer::ask`], whatever events are listed: for who says what is wrong with them.
    ///
    /// # Errors
    /// As [`Peer::ask`].
    pub fn ask_any_events(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        self.ask_judging(request, false)
    }

    fn ask_judging(&mut self, request: &PeerRequest, events: bool) -> Result<PeerAnswer, PeerFailure> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        self.questions_asked += 1;
        let mut question = json!(request);
        question["id"] = json!(self.questions_asked);
        let answer =
            self.line.exchange(&question).and_then(|line| answer(&line, self.questions_asked, request, events));
        answer.map_err(|fault| {
            let mut failure = PeerFailure { peer: self.identity.to_string(), fault, stderr: self.line.stderr_text() };
            if !failure.is_reported() {
                self.line.end();
                failure.stderr = self.line.stderr_text();
                self.failure = Some(failure.clone());
            }
            failure
        })
    }
}

impl Line {
    fn open(command: &mut Command, silence: Duration) -> io::Result<Self> {
        let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let (mut child, group) = Group::spawn(command)?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (to_peer, questions) = channel::<Vec<u8>>();
        // One line of look-ahead: a peer that floods its output waits in its own pipe.
        let (heard, from_peer) = sync_channel(1);
        let (alive, stderr_ended) = channel();
        let stderr = Arc::new(Mutex::new(Vec::new()));
        let line = Self { child, group, to_peer, from_peer, stderr: Arc::clone(&stderr), stderr_ended, silence };
        let (Some(mut input), Some(output), Some(complaints)) = pipes else {
            return Err(io::Error::other("a pipe to the peer is missing"));
        };
        // The threads are not joined: a grandchild that has left the group may keep a pipe open for as long as it likes.
        thread::Builder::new().spawn(move || questions.iter().try_for_each(|question| input.write_all(&question)))?;
        thread::Builder::new().spawn(move || read_lines(output, &heard))?;
        thread::Builder::new().spawn(move || store_tail(complaints, &stderr, &alive))?;
        Ok(line)
    }

    /// Sends one object and waits for one line.
    fn exchange(&mut self, question: &Value) -> Result<Vec<u8>, PeerFault> {
        // A writer that is gone means a peer that is gone, which the reader reports.
        let _ = self.to_peer.send(format!("{question}\n").into_bytes());
        match self.from_peer.recv_timeout(self.silence) {
            Ok(line) if line.len() > LINE_BYTES => {
                Err(PeerFault::nonsense(&format!("a line longer than {LINE_BYTES} bytes"), &line))
            }
            Ok(line) => Ok(line),
            Err(RecvTimeoutError::Disconnected) => Err(PeerFault::Died(self.status_in_words())),
            Err(RecvTimeoutError::Timeout) => Err(PeerFault::Silent(self.silence)),
        }
    }

    /// How a peer without output has ended.
    fn status_in_words(&mut self) -> String {
        let deadline = Instant::now() + GRACE;
        while Instant::now() < deadline {
            match self.child.try_wait() {
                Ok(Some(status)) => {
                    self.group.end();
                    return status.to_string();
                }
                Ok(None) => thread::sleep(Duration::from_millis(5)),
                Err(error) => return error.to_string(),
            }
        }
        "it closed its output and runs on".to_owned()
    }

    /// Ends the process and what it started, if they still run, and lets their last words arrive.
    fn end(&mut self) -> Option<ExitStatus> {
        let status = self.kill();
        let _ = self.stderr_ended.recv_timeout(GRACE);
        status
    }

    fn kill(&mut self) -> Option<ExitStatus> {
        self.group.end();
        // Errors here mean that it is gone already.
        let _ = self.child.kill();
        self.child.wait().ok()
    }

    fn stderr_text(&self) -> String {
        let stored = self.stderr.lock().unwrap_or_else(PoisonError::into_inner);
        printable(&String::from_utf8_lossy(&stored))
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        let _ = self.kill();
    }
}

/// Passes lines on until the asker is gone, the output ends, or a line is too long.
fn read_lines(output: ChildStdout, lines: &SyncSender<Vec<u8>>) {
    let mut output = BufReader::new(output);
    let mut line = Vec::new();
    while let Ok(1..) = output.by_ref().take(LINE_BYTES as u64 + 1).read_until(b'\n', &mut line) {
        let is_too_long = line.len() > LINE_BYTES;
        if lines.send(std::mem::take(&mut line)).is_err() || is_too_long {
            return;
        }
    }
}

/// Reads standard error to its end and stores the last [`STDERR_BYTES`]. `_alive` is dropped at the end.
fn store_tail(mut complaints: ChildStderr, tail: &Mutex<Vec<u8>>, _alive: &Sender<()>) {
    let mut chunk = [0; 4096];
    while let Ok(count @ 1..) = complaints.read(&mut chunk) {
        let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
        tail.extend_from_slice(&chunk[..count]);
        let excess = tail.len().saturating_sub(STDERR_BYTES);
        tail.drain(..excess);
    }
}

/// Reads the greeting.
fn greeting(line: &[u8]) -> Result<PeerIdentity, PeerFault> {
    let nonsense = |why: &str| PeerFault::nonsense(why, line);
    let said: Greeting = serde_json::from_slice(line).map_err(|error| nonsense(&format!("no greeting ({error})")))?;
    if said.name.trim().is_empty() {
        return Err(nonsense("a greeting without a name"));
    }
    let text = |text: Option<String>| escaped(&clipped(&text.unwrap_or_default(), NAME_CHARS));
    Ok(PeerIdentity {
        name: text(Some(said.name)),
        version: text(said.version),
        method: text(said.method),
        fixed_step: said.fixed_step == Some(true),
        reads_scene: said.reads.is_some(),
        claimed_orders: claimed_orders(said.order).map_err(|why| nonsense(&why))?,
    })
}

/// The orders of a greeting: a number, or an object of one for each quantity. The error says what is wrong.
fn claimed_orders(order: Option<Value>) -> Result<BTreeMap<String, f64>, String> {
    let orders = match order {
        None => return Ok(BTreeMap::new()),
        Some(Value::Object(orders)) => orders.into_iter().collect(),
        Some(order) => vec![(ORDER_OF_ALL.to_owned(), order)],
    };
    let number = |(name, order): (String, Value)| {
        if name != ORDER_OF_ALL && !ORDER_QUANTITIES.contains(&name.as_str()) {
            return Err(format!(
                "a greeting with an order of {name}, which is none of {}",
                ORDER_QUANTITIES.join(", ")
            ));
        }
        let positive = order.as_f64().filter(|order| *order > 0.0);
        positive.map(|order| (name, order)).ok_or_else(|| format!("a greeting with the order {order}"))
    };
    orders.into_iter().map(number).collect()
}

/// Reads the answer to question number `id`; its `events` are judged or not.
fn answer(line: &[u8], id: u64, request: &PeerRequest, events: bool) -> Result<PeerAnswer, PeerFault> {
    #[derive(Deserialize)]
    struct Head {
        id: Value,
        error: Option<String>,
        outcome: Option<String>,
    }
    // NaN and Infinity are no tokens of JSON and 1e400 is no number of f64: both fail here.
    let nonsense = |error: serde_json::Error| PeerFault::nonsense(&error.to_string(), line);
    let head: Head = serde_json::from_slice(line).map_err(nonsense)?;
    if head.id != json!(id) {
        let why = format!("it answers question {} and was asked question {id}", head.id);
        return Err(PeerFault::nonsense(&why, line));
    }
    if let Some(message) = head.error {
        return Err(PeerFault::Reported(excerpt(message.as_bytes())));
    }
    let mut answer: PeerAnswer = serde_json::from_slice(line).map_err(nonsense)?;
    if head.outcome.is_none() {
        answer.outcome = request.outcome_at(answer.depth_m);
    }
    if events && !answer.has_events_in_order(request) {
        return Err(PeerFault::nonsense("its events are not of the stages, each once, in the order of time", line));
    }
    Ok(answer)
}

/// The beginning of what was printed, on one line and harmless on a terminal.
fn excerpt(printed: &[u8]) -> String {
    escaped(&clipped(String::from_utf8_lossy(printed).trim_end(), QUOTED_CHARS))
}

/// Control characters as escapes, everything else as it is.
fn escaped(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

/// The last line of `text` that is not blank, bounded: a peer may write a line of megabytes.
fn last_line(text: &str) -> String {
    excerpt(text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("").as_bytes())
}

/// `text` in quotes after `before`, or nothing when there is none.
fn quote(before: &str, text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("{before}`{text}`") }
}

#[cfg(all(test, unix))]
mod tests;
