//! What `init` writes runs as it stands: each command that it prints does what it is for.
//!
//! Where the compiler or interpreter of a language is missing, its test says so in one line and counts as ignored; with
//! `CI=true` it fails. Julia is in no Debian release that is still maintained, and may be missing there too.

use std::env;
use std::path::Path;
use std::process::Command;

use libtest_mimic::Trial;
use serde_json::Value;

use crate::trials::{Check, Failure, ensure, required, trial};

/// Language, name of its file, the program that it needs, and how it is started.
const PEERS: [(&str, &str, &str, &str); 5] = [
    ("python", "peer.py", "python3", "python3 peer.py"),
    ("cpp", "peer.cpp", "g++", "./peer"),
    ("fortran", "peer.f90", "gfortran", "./peer"),
    ("julia", "peer.jl", "julia", "julia peer.jl"),
    ("octave", "peer.m", "octave-cli", "octave-cli peer.m"),
];

pub(crate) fn trials() -> Vec<Trial> {
    let peers = PEERS.map(|(language, file, needs, command)| {
        let name = format!("a_peer_in_{language}_runs_as_it_is_written_and_agrees_with_the_suite");
        let is_there = Command::new(needs).arg("--version").output().is_ok();
        if !is_there {
            eprintln!("the peer in {language} is not tested: {needs} is missing");
        }
        let may_be_ignored = !is_there && (!required() || language == "julia");
        trial(&name, move || runs_and_agrees(language, file, command)).with_ignored_flag(may_be_ignored)
    });
    let has_gfortran = Command::new("gfortran").arg("--version").output().is_ok();
    if !has_gfortran {
        eprintln!("the subroutine for Abaqus is not tested: gfortran is missing");
    }
    let subroutines = DRIVEN.map(|scene| {
        let name = format!("the_subroutine_for_abaqus_gives_the_scheme_of_{scene}_to_the_last_digits");
        trial(&name, move || subroutine_agrees(scene)).with_ignored_flag(!has_gfortran && !required())
    });
    let files = [("scene", "scene.toml"), ("suite", "suite.toml"), ("data", "data.csv")].map(|(kind, file)| {
        trial(&format!("the_{kind}_of_a_beginner_runs_as_it_is_written"), move || runs(kind, file))
    });
    let together = trial("the_suite_of_a_beginner_judges_the_peer_and_warns_of_nothing", judges_without_a_warning);
    let fault = trial("a_fault_put_into_a_beginners_peer_is_pointed_to_and_named", the_fault_is_named);
    peers.into_iter().chain(subroutines).chain(files).chain([together, fault]).collect()
}

/// What `command` prints in `folder`, where it must end well; `penetrode` is the program under test.
fn output(folder: &Path, command: &str) -> Result<String, Failure> {
    let program = Path::new(env!("CARGO_BIN_EXE_penetrode"));
    let own = program.parent().map(Path::to_owned).into_iter();
    let path = env::join_paths(own.chain(env::split_paths(&env::var_os("PATH").unwrap_or_default())))?;
    let said = Command::new("sh").args(["-c", command]).current_dir(folder).env("PATH", path).output()?;
    let text = String::from_utf8(said.stdout)?;
    ensure!(said.status.success(), "{command}: {text}{}", String::from_utf8_lossy(&said.stderr));
    Ok(text)
}

/// Writes `file` and gives the commands that are printed, without their remarks.
fn written(folder: &Path, arguments: &str, file: &str) -> Result<Vec<String>, Failure> {
    let said = output(folder, &format!("penetrode init {arguments}"))?;
    let (head, commands) = said.split_once('\n').unwrap_or_default();
    ensure!(head == format!("{file} is written. Next:"), "{said}");
    ensure!(said.lines().all(|line| line.chars().count() <= 80), "a long line: {said}");
    let without_remark = |line: &str| line.trim().split("   ").next().unwrap_or_default().to_owned();
    Ok(commands.lines().map(without_remark).collect())
}

fn runs(kind: &str, file: &str) -> Check {
    let folder = tempfile::tempdir()?;
    let commands = written(folder.path(), kind, file)?;
    ensure!(!commands.is_empty(), "no command");
    commands.iter().try_for_each(|command| output(folder.path(), command).map(drop))
}

/// Scenes whose subroutine is driven: stops in the tunnel and in the crater, exits, layers with a gap, a force as a table.
const DRIVEN: [&str; 8] =
    ["paper-slab", "thin-slab", "perforate", "forrestal-1994-shot-14", "crater", "air-gap", "softening", "viscous"];

/// The subroutine and the driver, compiled in each precision, beside what `export` says to expect.
///
/// In double precision at most two roundings were measured, in single precision none.
fn subroutine_agrees(scene: &str) -> Check {
    let folder = tempfile::tempdir()?;
    let said = output(folder.path(), &format!("penetrode export abaqus {scene} --out run --json"))?;
    let export: Value = serde_json::from_str(&said)?;
    let run = folder.path().join("run");
    for precision in ["double", "single"] {
        output(
            &run,
            &format!("gfortran -O0 -Wall -Werror=line-truncation -I {precision} vdload.f driver.f -o {precision}.run"),
        )?;
    }
    let rows = export["expected"].as_array().ok_or("no table")?;
    ensure!(rows.len() == 5, "{} rows", rows.len());
    for row in rows {
        let (dt, precision) = (&row["dt_s"], row["precision"].as_str().unwrap_or_default());
        let said = output(&run, &format!("./{precision}.run {dt}"))?;
        let words: Vec<&str> = said.split_whitespace().collect();
        let outcome = row["outcome"].as_str().unwrap_or_default();
        ensure!(words.len() == 5 && outcome.starts_with(words[0]), "{said} beside {row}");
        let allowed = if precision == "double" { 1e-14 } else { 1e-6 };
        for (word, key) in words[2..].iter().zip(["time_s", "depth_m", "velocity_m_s"]) {
            let (found, expected) = (word.parse::<f64>()?, row[key].as_f64().ok_or("no number")?);
            let off = (found - expected).abs() / expected.abs().max(1e-300);
            println!("{scene} {precision} {dt} {key}: {found:e} beside {expected:e}, {off:.1e}");
            ensure!(found == expected || off < allowed, "{key}: {said} beside {row}");
        }
    }
    Ok(())
}

fn judges_without_a_warning() -> Check {
    let folder = tempfile::tempdir()?;
    written(folder.path(), "suite", "suite.toml")?;
    written(folder.path(), "peer", "peer.py")?;
    let said = output(folder.path(), "penetrode verify suite.toml --peer 'python3 peer.py' 2>&1")?;
    ensure!(said.starts_with("passed: ") && said.contains(" 0 undecided, 0 skipped"), "{said}");
    Ok(())
}

fn runs_and_agrees(language: &str, file: &str, command: &str) -> Check {
    let folder = tempfile::tempdir()?;
    let commands = written(folder.path(), &format!("peer --language {language}"), file)?;
    let verify = format!("penetrode verify --only peer/user --peer \"{command}\"").replace("\"./peer\"", "./peer");
    ensure!(commands.contains(&verify), "{commands:?}");
    for command in &commands {
        let said = output(folder.path(), command)?;
        ensure!(!command.starts_with("penetrode diagnose ") || said.contains("verdict    sound"), "{said}");
        ensure!(*command != verify || said.starts_with("passed: 10 passed, 0 failed, "), "{said}");
    }
    let edges = output(folder.path(), &format!("penetrode stress --peer '{command}' --cases 20"))?;
    ensure!(edges.contains("passed: 13 passed, 0 failed"), "{edges}");
    lists_events_times_itself_and_outlives_what_it_cannot_solve(folder.path(), command)
}

/// From the template to the fault, as a person goes.
fn the_fault_is_named() -> Check {
    let folder = tempfile::tempdir()?;
    written(folder.path(), "peer", "peer.py")?;
    let (file, right, wrong) = (folder.path().join("peer.py"), "\"drag_kg_m\"))", "\"drag_kg_m\"))\n        q *= 0.5");
    let text = std::fs::read_to_string(&file)?;
    ensure!(text.contains(right), "the template has changed: {text}");
    std::fs::write(&file, text.replace(right, wrong))?;
    for command in ["verify --only peer/user --peer 'python3 peer.py'", "stress --peer 'python3 peer.py'"] {
        let said = output(folder.path(), &format!("penetrode {command}; test $? = 3"))?;
        ensure!(said.contains("what is wrong with it: penetrode diagnose 'python3 peer.py'"), "{said}");
    }
    let said = output(folder.path(), "penetrode diagnose 'python3 peer.py'; test $? = 3")?;
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    ensure!(words.contains("term:drag (certain): the drag q is 0.500000 times the right one"), "{said}");
    Ok(())
}

fn lists_events_times_itself_and_outlives_what_it_cannot_solve(folder: &Path, command: &str) -> Check {
    let question = |id: u32, drag: &str, end: &str| {
        let stage = |drag: &str, end: &str| {
            format!(
                r#"{{"static_force_n":1e6,"stiffness_n_m":0.0,"viscosity_kg_s":0.0,"drag_kg_m":{drag},"end_m":{end}}}"#
            )
        };
        format!(
            r#"{{"atol":[1e-12,1e-10],"exit_depth_m":0.2,"id":{id},"mass_kg":20.0,"repeats":3,"rtol":1e-12,"stages":[{},{},{}],"velocity_m_s":200.0}}"#,
            stage(drag, end),
            stage("0.0", "0.1"),
            stage("0.0", "null"),
        )
    };
    // The middle one is a stage without a number, as of a law that is no sum of these terms.
    let questions = [question(1, "0.0", "0.1"), question(2, "null", "0.1"), question(3, "0.0", "0.05")];
    std::fs::write(folder.join("questions"), questions.join("\n") + "\n")?;
    let said = output(folder, &format!("{command} < questions"))?;
    let answers = said.lines().map(serde_json::from_str).collect::<Result<Vec<Value>, _>>()?;
    ensure!(answers.len() == 3, "{said}");
    ensure!(answers[1]["error"].is_string() && answers[1]["id"] == 2, "{}", answers[1]);
    for (answer, id, first_end) in [(&answers[0], 1, 0.1), (&answers[2], 3, 0.05)] {
        // V² = V0² - 2 F x/M: 30,000 is left at 0.1 m, 20,000 at 0.2 m.
        let exit_speed = 20_000_f64.sqrt();
        let is_near = |value: &Value, wanted: f64| value.as_f64().is_some_and(|v| (v - wanted).abs() <= 1e-9 * wanted);
        ensure!(answer["id"] == id && answer["outcome"] == "perforated", "{answer}");
        ensure!(is_near(&answer["velocity_m_s"], exit_speed) && answer["depth_m"] == 0.2, "{answer}");
        ensure!(is_near(&answer["time_s"], (200.0 - exit_speed) / 5e4), "{answer}");
        ensure!(answer["wall_ns"].as_f64().is_some_and(|ns| ns > 0.0), "{answer}");
        let events = answer["events"].as_array().map(Vec::as_slice).unwrap_or_default();
        let listed: Vec<_> = events.iter().map(|event| (event["event"].as_str(), event["stage"].as_u64())).collect();
        ensure!(
            listed == [(Some("stage-end"), Some(0)), (Some("stage-end"), Some(1)), (Some("exit"), None)],
            "{answer}"
        );
        ensure!(
            events[0]["depth_m"] == first_end && is_near(&events[1]["velocity_m_s"], 30_000_f64.sqrt()),
            "{answer}"
        );
    }
    Ok(())
}
