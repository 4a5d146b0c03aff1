//! Another program put through the suite with `--peer` that dies, hangs or babbles: its claim fails with the reason,
//! exit code 3, the report is written, and nothing crashes or waits for ever.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::program::{Said, names, run_in};

const GREETING: &str = r#"echo '{"name": "mean", "version": "1", "method": "none"}'"#;

/// A right answer but for what a case puts in.
const ANSWER: &str = r#"{"id": 1, "outcome": "stopped-in-tunnel", "depth_m": 0.1, "time_s": 1e-3, "velocity_m_s": 0}"#;

/// Runs the claim on the user's program, a shell script, and gives what was said and how long it took.
fn judge(script: &str) -> (Said, Duration) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("peer.sh"), script).unwrap();
    let started = Instant::now();
    // Half a gigabyte of address space on top of the threads' stacks: megabytes on one line must not be kept.
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 2097152; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_penetrode")])
        .args(["verify", "--only", "peer/user", "--out", "report", "--json", "--peer", "sh peer.sh"])
        .current_dir(folder.path())
        .output();
    let (said, taken) = (Said::from(output.unwrap()), started.elapsed());
    let is_whole = folder.path().join("report/report.html").exists() && folder.path().join("report/junit.xml").exists();
    assert!(is_whole, "no report: {said:?}");
    (said.expect(3), taken)
}

/// The claim fails, and each remark holds `reason`.
fn fails_with(script: &str, reason: &str) {
    let report = judge(script).0.json();
    let claims = report["claims"].as_array().unwrap();
    assert!(!claims.is_empty());
    for claim in claims {
        assert_eq!(claim["verdict"], "failed", "{script}: {claim}");
        let remark = claim["remark"].as_str().unwrap();
        assert!(remark.contains(reason), "{script}: {remark}");
        assert!(remark.len() < 2000 && !remark.chars().any(char::is_control), "{remark:?}");
    }
}

/// Greets, then does `deed` at each question.
fn at_a_question(deed: &str) -> String {
    format!("read hello\n{GREETING}\nwhile read question; do {deed}; done\n")
}

#[test]
fn a_peer_that_dies_fails_its_claim() {
    fails_with(&at_a_question("echo 'out of luck' >&2; exit 7"), "out of luck");
    fails_with(&at_a_question("kill -SEGV $$"), "ended without an answer");
    fails_with("exit 1", "ended without an answer");
    fails_with("read hello; exit 0", "ended without an answer");
}

#[test]
fn a_peer_that_hangs_is_given_thirty_seconds() {
    // At a question, at the greeting, and with half a line: all three at once.
    std::thread::scope(|scope| {
        for script in
            [at_a_question("sleep 1000"), "sleep 1000".to_owned(), at_a_question("printf '{\"id\": '; sleep 1000")]
        {
            scope.spawn(move || {
                let (said, taken) = judge(&script);
                let report = said.json();
                assert!(report["claims"][0]["remark"].as_str().unwrap().contains("silent for 30 s"), "{report}");
                assert!((29..90).contains(&taken.as_secs()), "{script}: {taken:?}");
            });
        }
    });
}

#[test]
fn a_peer_that_answers_nonsense_fails_its_claim() {
    for (answer, reason) in [
        ("hello world", "nonsense"),
        ("", "nonsense"),
        ("[]", "nonsense"),
        ("null", "nonsense"),
        ("{}", "nonsense"),
        ("{\"id\": 1", "nonsense"),
        ("<html>404</html>", "nonsense"),
        ("{\"id\": 1, \"error\": \"cannot do this\"}", "cannot do this"),
        ("\u{1b}[2J\u{7}", "nonsense"),
    ] {
        fails_with(&at_a_question(&format!("echo '{answer}'")), reason);
    }
    fails_with(&at_a_question("printf '\\377\\376\\n'"), "nonsense");
    // Before the greeting as well.
    fails_with("echo 'Welcome to Solver 7'; sleep 60", "nonsense");
}

/// An answer with `from` replaced by `to`.
fn answers_with(from: &str, to: &str) {
    assert!(ANSWER.contains(from), "{from}");
    fails_with(&at_a_question(&format!("echo '{}'", ANSWER.replace(from, to))), "nonsense");
}

#[test]
fn a_peer_with_a_wrong_id_fails_its_claim() {
    for id in ["99", "\"1\"", "1.5", "-1", "1e400", "null"] {
        answers_with("\"id\": 1", &format!("\"id\": {id}"));
    }
}

#[test]
fn a_number_or_an_outcome_that_is_none_fails_its_claim() {
    for value in ["NaN", "Infinity", "1e999", "null", "\"0.1\"", "[0.1]"] {
        answers_with("\"depth_m\": 0.1", &format!("\"depth_m\": {value}"));
    }
    answers_with("stopped-in-tunnel", "landed on the moon");
}

#[test]
fn megabytes_are_cut_off() {
    // 256 MB on one line: more than the program may keep.
    fails_with(&at_a_question("head -c 268435456 /dev/zero | tr '\\0' x; echo"), "nonsense");
    fails_with(&at_a_question("yes '{\"id\": 1}'"), "nonsense");
    fails_with(&at_a_question("head -c 33554432 /dev/zero >&2; exit 1"), "ended without an answer");
    fails_with("head -c 268435456 /dev/zero", "nonsense");
}

#[test]
fn a_wrong_answer_in_right_form_fails_its_claim() {
    // The id is counted up as the questions come.
    let answer = ANSWER.replace("\"id\": 1", "\"id\": '$n'");
    let script = format!("read hello\n{GREETING}\nn=0\nwhile read question; do n=$((n + 1)); echo '{answer}'; done\n");
    let report = judge(&script).0.json();
    assert!(report["claims"].as_array().unwrap().iter().all(|claim| claim["verdict"] == "failed"), "{report}");
}

#[test]
fn a_peer_that_cannot_be_started_is_missing_and_no_command_is_usage() {
    let folder = tempfile::tempdir().unwrap();
    for (command, code) in [("no-such-program-anywhere", 5), ("/", 5), ("", 2), ("sh \"open quote", 2)] {
        let said = run_in(folder.path(), &format!("verify --only peer/user --out report --peer '{command}'"));
        assert!(said.expect(code).out.is_empty(), "{command}");
        assert_eq!(names(folder.path()), [""; 0], "{command}: something was written");
    }
}
