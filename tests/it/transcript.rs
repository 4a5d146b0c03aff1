//! What commands say, as it stands in `verification/transcript`: remade on request, and read again by a person.

#![expect(clippy::panic, reason = "a test that cannot be set up has failed")]

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use penetrode::suite::Program;
use penetrode::suite::transcript::{TRANSCRIPTS, Transcript};

/// `SNAPSHOTS=overwrite` writes what the runs say today; the claims `command/recorded` compare.
#[test]
fn every_transcript_is_written_as_it_is_read() {
    let program = Program::new(Path::new(env!("CARGO_BIN_EXE_penetrode"))).unwrap_or_else(|error| panic!("{error}"));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/transcript");
    for (name, _) in TRANSCRIPTS {
        let path = folder.join(format!("{name}.txt"));
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{error}"));
        let read = Transcript::read(&text).unwrap_or_else(|cause| panic!("{name}: {cause:?}"));
        assert!(!read.is_empty(), "{name}");
        if env::var("SNAPSHOTS").is_ok_and(|value| value == "overwrite") {
            let again = read.again(&program).unwrap_or_else(|cause| panic!("{name}: {cause:?}"));
            fs::write(&path, again.to_string()).unwrap_or_else(|error| panic!("{error}"));
        } else {
            assert_eq!(read.to_string(), text, "{name}: remake it with SNAPSHOTS=overwrite");
        }
    }
}

/// Options that no transcript gives: what they change is no text, or takes Python, minutes or the size of a machine.
const UNRECORDED: [(&str, &str); 9] = [
    ("audit", "--axis"),
    ("audit", "--id"),
    ("bench", "--most"),
    ("bench", "--out"),
    ("bench", "--peers"),
    ("bench", "--set"),
    ("stress", "--list"),
    ("stress", "--out"),
    ("verify", "--live-peers"),
];

/// An option that is ignored shows in no run that leaves it out: each stands in one, `--help` and `--quiet` apart.
#[test]
fn every_option_of_every_command_is_in_a_transcript() {
    let help = |words: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_penetrode")).args(words).arg("--help").output();
        String::from_utf8_lossy(&output.unwrap_or_else(|error| panic!("{error}")).stdout).into_owned()
    };
    let runs: Vec<Vec<&str>> = TRANSCRIPTS
        .iter()
        .flat_map(|(_, text)| text.lines())
        .filter_map(|line| Some(line.strip_prefix("$ ")?.split_whitespace().collect()))
        .collect();
    let whole = help(&[]);
    let names = whole.lines().filter_map(|line| line.strip_prefix("  ")?.split_once("  ")).map(|(name, _)| name);
    let commands: Vec<&str> = names.filter(|name| !name.starts_with([' ', '-']) && *name != "help").collect();
    assert!(commands.len() > 15, "{commands:?}");
    let mut lacking = Vec::new();
    for command in commands {
        let text = help(&[command]);
        let words = text.lines().filter_map(|line| {
            let line = line.trim_start();
            let line = line.strip_prefix('-').filter(|rest| !rest.starts_with('-')).map_or(line, |rest| &rest[1..]);
            let word = line.trim_start_matches([',', ' ']).split(|c: char| !c.is_alphanumeric() && c != '-').next();
            word.filter(|word| word.starts_with("--"))
        });
        for option in words.filter(|option| !["--help", "--quiet"].contains(option)) {
            let is_given = |run: &Vec<&str>| {
                let is_this = run.iter().take(2).any(|word| *word == command);
                is_this && run.iter().any(|word| word.split('=').next() == Some(option))
            };
            if !runs.iter().any(is_given) && !UNRECORDED.contains(&(command, option)) {
                lacking.push(format!("{command} {option}"));
            }
        }
    }
    assert!(lacking.is_empty(), "no run of verification/transcript gives {}", lacking.join(", "));
}
