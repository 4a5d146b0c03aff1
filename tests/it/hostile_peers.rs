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

/// Every claim fails; the remark of the first holds `reason`, and each of the others says `then`.
fn fails_with(script: &str, reason: &str, then: &str) {
    let report = judge(script).0.json();
    let claims = report["claims"].as_array().unwrap();
    assert!(claims.len() > 1);
    for (index, claim) in claims.iter().enumerate() {
        assert_eq!(claim["verdict"], "failed", "{script}: {claim}");
        let remark = claim["remark"].as_str().unwrap();
        assert!(if index == 0 { remark.contains(reason) } else { remark.ends_with(then) }, "{script}: {remark}");
        assert!(remark.len() < 2000 && !remark.chars().any(char::is_control), "{remark:?}");
    }
}

const AT_A_QUESTION: &str = "not asked: it failed at crater";
const AT_THE_GREETING: &str = "not asked: it failed at its greeting";

/// Greets, then does `deed` at each question.
fn at_a_question(deed: &str) -> String {
    format!("read hello\n{GREETING}\nwhile read question; do {deed}; done\n")
}

/// What else a peer may say or do is tested where it is read, src/exchange/peers/process/tests.rs.
#[test]
fn a_peer_that_dies_or_answers_nonsense_fails_its_claim() {
    for (deed, reason) in [
        ("echo 'out of luck' >&2; exit 7", "out of luck"),
        ("kill -SEGV $$", "ended without an answer"),
        ("echo hello world", "nonsense"),
        ("printf '\\033[2J\\007\\n'", "nonsense"),
        ("printf '\\377\\376\\n'", "nonsense"),
    ] {
        fails_with(&at_a_question(deed), reason, AT_A_QUESTION);
    }
    fails_with("echo 'Welcome to Solver 7'; sleep 60", "nonsense", AT_THE_GREETING);
    // Who says that it cannot do this is asked the next.
    let sorry = "read hello\n".to_owned()
        + GREETING
        + "\nn=0\nwhile read question; do n=$((n + 1)); echo '{\"id\": '$n', \"error\": \"cannot do this\"}'; done";
    fails_with(&sorry, "cannot do this", "cannot do this");
}

/// A person reads what happened once, and the same in every run.
#[test]
fn a_failure_of_a_peer_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    for (deed, reason, lines) in [("echo oops >&2; exit 7", "`oops`", 11), ("echo hello", "it printed `hello`", 11)] {
        fs::write(folder.path().join("peer.sh"), at_a_question(deed)).unwrap();
        let said = || run_in(folder.path(), "verify --only peer/user --out report --peer 'sh peer.sh'").expect(3);
        let Said { out, err, .. } = said();
        assert_eq!((out.matches(reason).count(), out.lines().count()), (1, lines), "{out}");
        assert!(out.starts_with("failed    peer/user/crater") && out.contains("and 8 more of peer/user"), "{out}");
        assert_eq!((said().out, err.as_str()), (out, ""));
    }
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
fn megabytes_are_cut_off() {
    // 256 MB on one line: more than the program may keep.
    fails_with(&at_a_question("head -c 268435456 /dev/zero | tr '\\0' x; echo"), "nonsense", AT_A_QUESTION);
    fails_with(&at_a_question("yes '{\"id\": 1}'"), "nonsense", AT_A_QUESTION);
    let dies = at_a_question("head -c 33554432 /dev/zero >&2; exit 1");
    fails_with(&dies, "ended without an answer", AT_A_QUESTION);
    fails_with("head -c 268435456 /dev/zero", "nonsense", AT_THE_GREETING);
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
fn a_peer_that_cannot_be_started_is_missing_and_one_that_cannot_be_asked_is_usage() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = tempfile::tempdir().unwrap();
    let greets = |name: &str, fields: &str| {
        let path = scripts.path().join(name);
        fs::write(&path, format!("read hello; echo '{{\"name\": \"own\", {fields}}}'; read question")).unwrap();
        format!("sh {}", path.display())
    };
    let fixed = greets("fixed", "\"fixed_step\": true");
    let of_scenes = greets("of-scenes", "\"reads\": \"scene\"");
    for (command, code) in [
        ("no-such-program-anywhere", 5),
        ("/", 5),
        ("sh no-such-script", 5),
        ("sh -c \"read q; exit 0\"", 5),
        ("", 2),
        ("sh \"open quote", 2),
        (&fixed, 2),
        (&of_scenes, 2),
    ] {
        for asks in ["verify --only peer/user --out report", "bench @tunnel --parts work-precision"] {
            let said = run_in(folder.path(), &format!("{asks} --peer '{command}'")).expect(code);
            assert!(said.out.is_empty() && said.err.lines().count() <= 4, "{command}: {said:?}");
            assert_eq!(names(folder.path()), [""; 0], "{command}: something was written");
        }
    }
}
