//! What a peer may do instead of answering, played by shell scripts.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use super::*;
use crate::physics::{Outcome, Stage};

const GREETING: &str = r#"read q; echo '{"name": "fake", "version": "1", "method": "none"}'"#;
const ANSWER: &str = r#"{"id": 1, "outcome": "stopped", "depth_m": 0.5, "time_s": 2e-3, "velocity_m_s": 0}"#;

fn sh(script: &str) -> String {
    format!("sh -c {}", shlex::try_quote(script).unwrap())
}

fn request() -> PeerRequest {
    PeerRequest {
        mass_kg: 1.0,
        velocity_m_s: 1.0,
        exit_depth_m: None,
        rtol: 1e-9,
        atol: [1e-9, 1e-9],
        repeats: 1,
        stages: vec![Stage::tunnel(1.0, 0.0)],
        dt_s: None,
        scene: None,
    }
}

/// A peer that greets and then does `script`; the first question is in its pipe.
fn peer(script: &str) -> Peer {
    peer_within(script, SILENCE)
}

fn peer_within(script: &str, silence: Duration) -> Peer {
    Peer::start_within(&sh(&format!("{GREETING}; {script}")), silence).unwrap()
}

const IMPATIENT: Duration = Duration::from_millis(400);

/// The failure of a peer that prints `line` as its answer.
fn failure_of_answer(line: &str) -> PeerFailure {
    peer(&format!("read q; printf '%b\\n' {}; sleep 5", shlex::try_quote(line).unwrap())).ask(&request()).unwrap_err()
}

fn nonsense_of_answer(line: &str) -> String {
    match failure_of_answer(line).fault {
        PeerFault::Nonsense { why, .. } => why,
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
    peer.line.silence = IMPATIENT;
    let failure = peer.ask(&request()).unwrap_err();
    let question: Value = serde_json::from_str(failure.stderr.lines().last().unwrap()).unwrap();
    let stage =
        json!({"static_force_n": 1.0, "stiffness_n_m": 0.0, "viscosity_kg_s": 0.0, "drag_kg_m": 0.0, "end_m": null});
    let wanted = json!({"id": 1, "mass_kg": 1.0, "velocity_m_s": 1.0, "exit_depth_m": null, "rtol": 1e-9,
        "atol": [1e-9, 1e-9], "scene": null, "repeats": 1, "stages": [stage]});
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
    let mut peer = peer_within("exec sleep 60", IMPATIENT);
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
    let PeerFault::Died(status) = &failure.fault else { unreachable!("{failure}") };
    assert_eq!(status, "it closed its output and runs on");
}

#[test]
fn nonsense_is_quoted() {
    let failure = failure_of_answer("Loading solver ... done");
    let words = "fake 1 none answers nonsense: expected value at line 1 column 1; it printed `Loading";
    assert!(failure.to_string().starts_with(words), "{failure}");
    let event = r#"{"event": "\\033[31m", "time_s": 0, "depth_m": 0, "velocity_m_s": 0}"#;
    let why = nonsense_of_answer(&format!(r#"{{"id": 1, "events": [{event}]}}"#));
    assert!(!why.chars().any(char::is_control), "{why:?}");
    let long = ANSWER.replace("0.5", &format!("{:?}", "x".repeat(100_000)));
    assert_eq!(nonsense_of_answer(&long).chars().count(), QUOTED_CHARS + 1);
}

#[test]
fn events_are_of_the_stages_each_once_in_the_order_of_time() {
    let event =
        |name: &str, time: f64| format!(r#"{{"event": {name}, "time_s": {time}, "depth_m": 0.1, "velocity_m_s": 0}}"#);
    let with =
        |events: &[String]| ANSWER.replace(r#""id": 1"#, &format!(r#""id": 1, "events": [{}]"#, events.join(", ")));
    let (stage, rest) = (r#""stage-end", "stage": 0"#, r#""rest""#);
    for events in [
        [event(rest, 2e-3), event(stage, 1e-3)],
        [event(stage, 1e-3), event(stage, 1e-3)],
        [event(r#""stage-end", "stage": 1"#, 1e-3), event(rest, 2e-3)],
    ] {
        assert!(nonsense_of_answer(&with(&events)).contains("in the order of time"), "{events:?}");
    }
    // Found apart, two events of one place differ in time by less than the tolerance.
    let answer = with(&[event(stage, 2e-3), event(rest, 2e-3 * (1.0 - 1e-12))]);
    assert_eq!(peer(&format!("read q; echo '{answer}'; read q")).ask(&request()).unwrap().events.len(), 2);
}

/// No answer, an answer to another question, and one that is no number or no outcome, each with words of the refusal.
#[test]
fn what_is_no_answer_says_why() {
    let with = |from: &str, to: &str| ANSWER.replace(from, to);
    let of_id = |id: &str| with(r#""id": 1"#, &format!(r#""id": {id}"#));
    let texts = ["[1, 2]", "[]", "null", "{}", r#"{"id": 1"#, "<html>404</html>"].map(|text| (text.to_owned(), ""));
    let ids = ["99", "1.5", "-1", "1e400", "null"].map(|id| (of_id(id), ""));
    // All are refused where they stand, in whatever words.
    let depths = ["NaN", "Infinity", "-Infinity", "nan", "1e400", "-1e400", "1e999", r#""0.1""#, "[0.1]"];
    for (answer, words) in
        texts.into_iter().chain(ids).chain(depths.map(|depth| (with("0.5", depth), " at line 1 column "))).chain([
            (String::new(), "EOF"),
            (with("0.5", r#""half a metre""#), "invalid type"),
            ("[".repeat(5000), "line 1"),
            (of_id("2"), "it answers question 2 and was asked question 1"),
            (of_id(r#""1""#), "question \"1\""),
            (with(r#""id": 1, "#, ""), "missing field `id`"),
            (with("0.5", "null"), "null, expected f64"),
            (r#"{"id": 1}"#.to_owned(), "missing field `depth_m`"),
            (with("stopped", "vaporised"), "unknown variant `vaporised`, expected one of `stopped-in-crater`, "),
        ])
    {
        let why = nonsense_of_answer(&answer);
        assert!(!why.is_empty() && why.contains(words), "{answer:.100}: {why}");
    }
}

#[test]
fn megabytes_without_a_line_end_are_cut_off() {
    let failure = peer("read q; yes | tr -d '\\n'").ask(&request()).unwrap_err();
    let PeerFault::Nonsense { why, printed } = &failure.fault else { unreachable!("{failure}") };
    assert_eq!(why, "a line longer than 1048576 bytes");
    assert_eq!(printed.chars().count(), QUOTED_CHARS + 1);
    // Megabytes of lines are nonsense at the first.
    let failure = peer("read q; yes").ask(&request()).unwrap_err();
    assert!(matches!(failure.fault, PeerFault::Nonsense { printed, .. } if printed == "y"));
}

#[test]
fn megabytes_on_standard_error_block_nothing_and_only_the_end_is_kept() {
    let flood = "head -c 3000000 /dev/zero | tr '\\0' x >&2; echo >&2; echo the end >&2";
    let mut peer = peer(&format!("read q; {flood}; echo '{ANSWER}'; exit 0"));
    peer.ask(&request()).unwrap();
    let failure = peer.ask(&request()).unwrap_err();
    assert_eq!(failure.stderr.len(), STDERR_BYTES);
    assert_eq!(last_line(&failure.stderr), "the end");
}

#[test]
fn a_peer_that_does_not_read_a_long_question_is_silent_and_blocks_nothing() {
    let mut peer = peer_within("exec sleep 60", IMPATIENT);
    let long = PeerRequest { stages: vec![request().stages[0]; 20_000], ..request() };
    assert!(matches!(peer.ask(&long).unwrap_err().fault, PeerFault::Silent(_)));
}

#[test]
fn a_grandchild_that_keeps_the_pipes_open_blocks_nothing() {
    let started = Instant::now();
    let mut peer = peer("read q; sleep 8 & exit 3");
    peer.line.silence = IMPATIENT;
    assert!(peer.ask(&request()).is_err());
    drop(peer);
    assert!(started.elapsed() < Duration::from_secs(7), "{:?}", started.elapsed());
}

/// Standard error ends when the last process that holds it has ended.
#[test]
fn what_a_peer_started_ends_with_it_whether_it_hangs_dies_or_is_dropped() {
    for script in ["sleep 60 & read q; exec sleep 60", "sleep 60 & read q; exit 3", "sleep 60 & exec cat"] {
        let mut peer = peer_within(script, IMPATIENT);
        if script.ends_with("cat") {
            let ended = std::mem::replace(&mut peer.line.stderr_ended, channel().1);
            drop(peer);
            assert_eq!(ended.recv_timeout(Duration::from_secs(20)), Err(RecvTimeoutError::Disconnected), "{script}");
        } else {
            assert!(peer.ask(&request()).is_err());
            let ended = peer.line.stderr_ended.recv_timeout(Duration::from_secs(20));
            assert_eq!(ended, Err(RecvTimeoutError::Disconnected), "{script}");
        }
    }
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
fn a_peer_that_ends_before_it_greets_is_missing_something() {
    let error = Peer::start(&sh("echo 'scikit-sundae is not installed' >&2; exit 5")).unwrap_err();
    assert!(error.is_missing());
    assert!(error.to_string().ends_with("lacks what it needs: scikit-sundae is not installed"), "{error}");
    for (script, words) in [
        ("exit 4", "`sh -c 'exit 4'` ended before it greeted (exit status: 4)"),
        ("read q; echo 'no such file' >&2; exit 2", "greeted (exit status: 2); on standard error `no such file`"),
    ] {
        let error = Peer::start(&sh(script)).unwrap_err();
        assert!(error.is_missing() && !error.is_usage());
        assert!(error.to_string().ends_with(words), "{error}");
    }
}

#[test]
fn a_peer_of_fixed_steps_or_scenes_is_not_asked_for_a_tolerance() {
    let greeting = |fields: &str| sh(&format!(r#"read q; echo '{{"name": "own"{fields}}}'; read q"#));
    for (fields, why) in [
        (r#", "fixed_step": true"#, "takes fixed steps, and"),
        (r#", "reads": "scene""#, "reads the physical scene, and"),
    ] {
        let command = greeting(fields);
        assert!(Peer::start(&command).is_ok());
        let error = Peer::start_adaptive(&command).unwrap_err();
        assert!(error.is_usage() && error.to_string().contains(why) && error.help().contains("diagnose"), "{error}");
    }
    assert!(Peer::start_adaptive(&greeting(r#", "fixed_step": false, "order": 5"#)).is_ok());
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
fn a_greeting_says_how_the_peer_is_asked_and_what_it_claims() {
    let said = |fields: &str| greeting(format!(r#"{{"name": "own"{fields}}}"#).as_bytes());
    let plain = PeerIdentity { name: "own".to_owned(), ..PeerIdentity::default() };
    for fields in [
        "",
        r#", "note": 1"#,
        r#", "fixed_step": false, "order": {}"#,
        r#", "reads": null, "version": null, "order": null"#,
    ] {
        assert_eq!(said(fields), Ok(plain.clone()), "{fields}");
    }
    let identity = said(r#", "fixed_step": true, "reads": "scene", "order": 4"#).unwrap();
    assert!(identity.fixed_step && identity.reads_scene);
    assert_eq!(identity.claimed_orders, BTreeMap::from([(ORDER_OF_ALL.to_owned(), 4.0)]));
    let each = said(r#", "order": {"depth": 2, "crater_end_time": 0.5}"#).unwrap().claimed_orders;
    assert_eq!(each, BTreeMap::from([("depth".to_owned(), 2.0), ("crater_end_time".to_owned(), 0.5)]));
    for (fields, why) in [
        (r#", "fixed_step": "yes""#, "expected a boolean"),
        (r#", "reads": "stages""#, "unknown variant `stages`, expected `scene`"),
        (r#", "order": 0"#, "the order 0"),
        (r#", "order": -1.5"#, "the order -1.5"),
        (r#", "order": "2""#, "the order \"2\""),
        (r#", "order": {"depth": null}"#, "the order null"),
        (r#", "order": {"energy": 2}"#, "an order of energy, which is none of depth, time, velocity, "),
    ] {
        let Err(PeerFault::Nonsense { why: said, .. }) = said(fields) else { unreachable!("{fields}") };
        assert!(said.contains(why), "{fields}: {said}");
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
