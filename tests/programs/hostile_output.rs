//! Results that have nowhere to go, or meet something in their place, or are interrupted; and texts of a person's files
//! on their way into terminals, pages and tables.
//!
//! A report or a table is the old one, the new one or none, never half of one, and nobody's file is replaced.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use libtest_mimic::Trial;

use crate::program::{names, program, run_in, scene};

/// A folder with a scene, a table of scenes, a table of measured points and one of shots.
fn workplace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    fs::copy(scene("paper-slab"), place("slab.toml")).unwrap();
    fs::copy("verification/experiments/huang2011_penetration.csv", place("shots.csv")).unwrap();
    fs::write(place("points.svg"), "H/d,E_c/(d3 fc)\n3,10.5\n").unwrap();
    let rows = "mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,velocity_m_s\n2,0.05,0.72,36e6,2300,300\n";
    fs::write(place("rows.csv"), rows).unwrap();
    folder
}

const SWEEP: &str = "sweep slab.toml --vary H/d=1:5:3";

/// Commands that write a table, without the name of it.
const TABLES: [&str; 5] = [
    "solve slab.toml --trajectory",
    "batch rows.csv --out",
    "sweep slab.toml --vary H/d=1:5:3 --out",
    "map --out",
    "experiments shots.csv --out",
];

fn an_input_is_never_replaced() {
    let folder = workplace();
    let contents = || -> Vec<_> {
        names(folder.path()).into_iter().map(|name| (fs::read(folder.path().join(&name)).unwrap(), name)).collect()
    };
    let before = contents();
    #[cfg(unix)]
    std::os::unix::fs::symlink("slab.toml", folder.path().join("link.csv")).unwrap();
    for line in [
        "solve slab.toml --trajectory slab.toml",
        "solve slab.toml --trajectory ./slab.toml",
        "solve slab.toml --trajectory link.csv",
        "batch rows.csv --out rows.csv",
        "batch rows.csv --out ./rows.csv",
        &format!("{SWEEP} --out slab.toml"),
        &format!("{SWEEP} --out link.csv"),
        &format!("{SWEEP} --data points.svg --out points.svg"),
        // The figure would land on the points.
        &format!("{SWEEP} --data points.svg --out points.csv"),
        // The figure would land on the table.
        &format!("{SWEEP} --out new.svg"),
        "map --out new.svg",
        "experiments shots.csv --out shots.csv",
        "experiments shots.csv --out new.svg",
    ] {
        let refused = run_in(folder.path(), line).refused();
        assert!(refused.contains("would replace") && refused.contains(" help: name "), "{line}: {refused}");
    }
    fs::remove_file(folder.path().join("link.csv")).unwrap();
    assert!(contents() == before, "{:?}", names(folder.path()));
}

fn what_cannot_be_written_says_why_and_leaves_nothing() {
    for command in TABLES {
        let folder = workplace();
        fs::create_dir(folder.path().join("folder")).unwrap();
        // A figure's place is taken by a folder: then there is no table either.
        fs::create_dir(folder.path().join("taken.svg")).unwrap();
        let has_figure = !command.starts_with("solve") && !command.starts_with("batch");
        let before = names(folder.path());
        for (path, remedy, code) in [
            ("missing/out.csv", "there is no folder missing help: make the folder first", 2),
            ("folder", "it is a folder help: name a file in it", 2),
            ("slab.toml/out.csv", "slab.toml is a file help: name a folder", 2),
            ("/proc/out.csv", "cannot write /proc/out.csv", 1),
            ("taken.csv", "it is a folder help: name a file in it", 2),
        ] {
            if path == "taken.csv" && !has_figure {
                continue;
            }
            let said = run_in(folder.path(), &format!("{command} {path}")).expect(code);
            assert!(said.words().contains("cannot") && said.words().contains(remedy), "{command} {path}: {said:?}");
            assert!(!said.err.contains(".penetrode-"), "the name of a temporary file: {said:?}");
            assert_eq!(names(folder.path()), before, "{command:?} {path}");
        }
    }
}

#[cfg(target_os = "linux")]
fn a_pipe_and_a_broken_link_are_no_files_and_a_link_stays() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = workplace();
    let place = |name: &str| folder.path().join(name);
    assert!(Command::new("mkfifo").arg(place("pipe.csv")).status().unwrap().success());
    symlink("nowhere.csv", place("broken.csv")).unwrap();
    for command in TABLES {
        for name in ["pipe.csv", "broken.csv"] {
            let said = run_in(folder.path(), &format!("{command} {name}")).expect(2);
            assert!(said.err.contains("it is a device, a pipe"), "{said:?}");
        }
    }
    assert!(fs::symlink_metadata(place("pipe.csv")).unwrap().file_type().is_fifo());
    assert!(!place("nowhere.csv").exists());

    fs::write(place("real.csv"), "old").unwrap();
    symlink("real.csv", place("link.csv")).unwrap();
    run_in(folder.path(), "batch rows.csv --out link.csv").expect(0);
    assert!(fs::symlink_metadata(place("link.csv")).unwrap().is_symlink());
    assert!(fs::read_to_string(place("real.csv")).unwrap().starts_with("row,outcome"));
}

#[cfg(target_os = "linux")]
fn a_standard_error_that_cannot_be_written_changes_no_exit_code() {
    let folder = workplace();
    for (line, code) in [("solve missing.toml", 2), ("batch rows.csv --out t.csv", 0)] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let status = program(folder.path(), line).stdout(Stdio::null()).stderr(full).status().unwrap();
        assert_eq!(status.code(), Some(code), "{line}");
    }
}

fn a_report_goes_into_a_new_an_empty_or_its_own_folder_alone() {
    let folder = workplace();
    let verify = |out: &str| run_in(folder.path(), &format!("verify --only eq15 --out {out}"));
    fs::create_dir(folder.path().join("empty")).unwrap();
    for out in ["new", "empty", "new", "deep/down"] {
        verify(out).expect(0);
        assert!(folder.path().join(out).join("report.html").exists());
    }
    // One on a part of the claims has a folder of its own, and takes the place of no other.
    run_in(folder.path(), "verify --only eq15").expect(0);
    assert!(folder.path().join("penetrode-report-part/report.html").exists());
    let suite = run_in(folder.path(), "init suite").expect(0).out;
    assert!(suite.contains("penetrode verify suite.toml"), "{suite}");
    run_in(folder.path(), "verify suite.toml --out whole").expect(0);
    let refused = run_in(folder.path(), "verify --only eq15 --out whole").refused();
    assert!(refused.contains("whole holds a report on all claims"), "{refused}");
    run_in(folder.path(), "verify suite.toml --out penetrode-report-part").expect(0);
    fs::write(folder.path().join("new/notes.txt"), "years of work").unwrap();
    fs::create_dir(folder.path().join("thesis")).unwrap();
    fs::write(folder.path().join("thesis/thesis.txt"), "years of work").unwrap();
    for (out, why) in [
        ("new", "holds `notes.txt`"),
        ("thesis", "is not a report of penetrode"),
        ("slab.toml", "is a file, and a report is a folder"),
    ] {
        let words = verify(out).refused();
        assert!(words.contains(why) && words.contains("help: name another folder with --out"), "{words}");
    }
    assert_eq!(fs::read_to_string(folder.path().join("new/notes.txt")).unwrap(), "years of work");
    let refused = run_in(folder.path(), "stress --cases 1 --out thesis").refused();
    assert!(refused.contains("is not a report of penetrode"), "{refused}");
    assert_eq!(names(&folder.path().join("thesis")), ["thesis.txt"]);
    let said = verify("/proc/report").expect(1);
    assert!(!said.err.contains(".penetrode-"), "{said:?}");
    assert!(!names(folder.path()).iter().any(|name| name.starts_with('.')), "{:?}", names(folder.path()));
}

fn a_table_may_go_to_standard_output() {
    let folder = workplace();
    let before = names(folder.path());
    for command in TABLES {
        let said = run_in(folder.path(), &format!("{command} -")).expect(0);
        let mut table = csv::Reader::from_reader(said.out.as_bytes());
        let width = table.headers().unwrap().len();
        assert!(width > 2 && table.records().map(Result::unwrap).count() > 0, "{command}");
        if !command.starts_with("batch") {
            run_in(folder.path(), &format!("{command} - --json")).expect(2);
        }
    }
    assert_eq!(names(folder.path()), before);
}

fn a_reader_that_goes_away_is_no_error() {
    let folder = workplace();
    for line in ["solve slab.toml", "batch random:200000 --out -", "sweep slab.toml --vary H/d=1:18:2000 --out -"] {
        let mut command = program(folder.path(), line);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let said = crate::program::Said::from(child.wait_with_output().unwrap()).expect(0);
        assert!(!said.err.contains("error"), "{line}: {said:?}");
    }
}

/// Whether `folder` holds a whole report, or does not exist.
fn assert_whole_or_none(folder: &Path, when: Duration) {
    if !folder.exists() {
        return;
    }
    let list = fs::read_to_string(folder.join("contents.txt")).unwrap_or_else(|e| panic!("killed after {when:?}: {e}"));
    for name in list.lines() {
        assert!(folder.join(name).exists(), "killed after {when:?}: {name} is missing");
    }
    let report = fs::read(folder.join("report.json")).unwrap();
    assert!(serde_json::from_slice::<serde_json::Value>(&report).is_ok(), "killed after {when:?}: half a report.json");
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.trim_end().ends_with("</html>"), "killed after {when:?}: half a page");
}

fn an_interrupted_run_leaves_the_old_results_or_none() {
    let folder = workplace();
    let report = folder.path().join("report");
    let verify = "verify --only closed-form --out report";
    let table = folder.path().join("out.csv");
    let batch = "batch random:60000 --out out.csv";
    let started = Instant::now();
    assert!([0, 3, 4].contains(&run_in(folder.path(), verify).code));
    let verify_takes = started.elapsed();
    let started = Instant::now();
    run_in(folder.path(), batch).expect(0);
    let batch_takes = started.elapsed();
    let old = fs::read(&table).unwrap();
    for signal in ["INT", "KILL"] {
        for part in 1..=6 {
            for (line, takes) in [(verify, verify_takes), (batch, batch_takes)] {
                let when = takes * part / 5;
                let mut command = program(folder.path(), line);
                let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
                thread::sleep(when);
                // It may have ended before.
                let _ =
                    Command::new("kill").args(["-s", signal, &child.id().to_string()]).stderr(Stdio::null()).status();
                child.wait().unwrap();
                assert_whole_or_none(&report, when);
                assert!(fs::read(&table).unwrap() == old, "{signal} after {when:?}: half a table");
            }
        }
    }
    // And what was left behind does not stand in the way of the next run.
    assert!([0, 3, 4].contains(&run_in(folder.path(), verify).code));
    assert_whole_or_none(&report, Duration::ZERO);
    assert!(report.exists());
}

/// `line` in `folder`, begun to make temporary files there or in `folder/tmp`.
#[cfg(target_os = "linux")]
fn begun(folder: &Path, line: &str) -> std::process::Child {
    let names_of_both = || (names(folder), names(&folder.join("tmp")));
    let before = names_of_both();
    let program = program(folder, line);
    // Whoever runs the tests in the background of a script has interrupts ignored, and so would the program.
    let mut command = Command::new("env");
    command.arg("--default-signal").arg(program.get_program()).args(program.get_args()).current_dir(folder);
    command.env("TMPDIR", folder.join("tmp")).stdout(Stdio::null()).stderr(Stdio::null());
    let child = command.spawn().unwrap();
    let started = Instant::now();
    while names_of_both() == before {
        assert!(started.elapsed() < Duration::from_secs(20), "{line}: nothing is made");
        thread::sleep(Duration::from_millis(1));
    }
    child
}

#[cfg(target_os = "linux")]
fn send(signal: &str, child: &std::process::Child) {
    assert!(Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
}

#[cfg(target_os = "linux")]
fn an_interrupted_run_leaves_nothing_behind() {
    use std::os::unix::process::ExitStatusExt;
    let folder = workplace();
    fs::create_dir(folder.path().join("tmp")).unwrap();
    let before = names(folder.path());
    for (signal, number) in [("INT", 2), ("TERM", 15), ("HUP", 1)] {
        // Runs of many seconds: on a busy machine one may pass before the signal.
        for line in ["batch random:3000000 --method enclosure --out out.csv", "verify --only recorded --out report"] {
            let mut child = begun(folder.path(), line);
            thread::sleep(Duration::from_millis(100));
            send(signal, &child);
            assert_eq!(child.wait().unwrap().signal(), Some(number), "{line}");
            assert_eq!(names(folder.path()), before, "{signal}: {line}");
            // What `verify` had started ends by itself.
            let ended = Instant::now();
            while !names(&folder.path().join("tmp")).is_empty() {
                assert!(ended.elapsed() < Duration::from_secs(30), "{signal}: {:?}", names(&folder.path().join("tmp")));
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
}

/// As `nohup` starts it.
#[cfg(target_os = "linux")]
fn a_signal_that_is_ignored_stays_so() {
    let folder = workplace();
    let script = format!("trap '' HUP; exec {} batch random:30000 --out out.csv", env!("CARGO_BIN_EXE_penetrode"));
    let mut command = Command::new("sh");
    command.args(["-c", &script]).current_dir(folder.path()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    thread::sleep(Duration::from_millis(100));
    send("HUP", &child);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(folder.path().join("out.csv").exists());
}

fn no_output_has_the_name_of_a_scene() {
    let folder = workplace();
    let scene = fs::read(folder.path().join("slab.toml")).unwrap();
    let before = names(folder.path());
    for (line, path) in TABLES.into_iter().flat_map(|line| [(line, "new.toml"), (line, "slab.TOML")]) {
        let refused = run_in(folder.path(), &format!("{line} {path}")).refused();
        assert!(refused.contains("such a file is a scene or a suite"), "{line}: {refused}");
    }
    let refused = run_in(folder.path(), "map --out slab.toml").refused();
    assert!(refused.contains("the table cannot go to slab.toml"), "{refused}");
    assert!(fs::read(folder.path().join("slab.toml")).unwrap() == scene);
    assert_eq!(names(folder.path()), before);
}

/// A tmpfs of 256 KiB, unmounted when dropped; `None` where this user may not mount.
struct SmallDisk(PathBuf, #[expect(dead_code, reason = "its folder lives as long")] tempfile::TempDir);

impl SmallDisk {
    fn new() -> Option<Self> {
        let folder = tempfile::tempdir().ok()?;
        let path = folder.path().to_owned();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=256k", "tmpfs"])
            .arg(&path)
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success());
        mounted.then_some(Self(path, folder))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

fn a_full_disk_leaves_the_old_results() {
    let disk = SmallDisk::new().unwrap();
    let place = workplace();
    let out = |name: &str| disk.0.join(name).display().to_string();
    let (csv, report) = (out("out.csv"), out("report"));
    // Small results fit, and are the old ones.
    run_in(place.path(), &format!("{SWEEP} --out {csv}")).expect(0);
    run_in(place.path(), &format!("verify --only eq15 --out {report}")).expect(0);
    let old = fs::read(&csv).unwrap();
    let before = names(&disk.0);
    let contents = names(&disk.0.join("report"));
    for line in [
        format!("batch random:20000 --out {csv}"),
        format!("sweep slab.toml --vary H/d=1:18:4000 --out {csv}"),
        format!("solve slab.toml --method central-difference --dt '10 ns' --trajectory {csv}"),
        format!("verify --only e --out {report}"),
    ] {
        let said = run_in(place.path(), &line).expect(1);
        let is_named = ["no storage space", "No space left"].iter().any(|cause| said.words().contains(cause));
        assert!(is_named && said.words().contains("make room on the disk"), "{said:?}");
        assert!(!said.err.contains(".penetrode-"), "{said:?}");
        assert!(fs::read(&csv).unwrap() == old, "{line}: the old table is gone");
        assert_eq!(names(&disk.0), before, "{line}");
        assert_eq!(names(&disk.0.join("report")), contents, "{line}");
        assert_whole_or_none(&disk.0.join("report"), Duration::ZERO);
    }
}

const HOSTILE: &str = "<script>alert(1)</script> ]]> & \\u001b[31m \\u0007 =1+1 \\u202e \\\" ' `x`";

/// Whether a terminal would obey `text`.
fn steers(text: &str) -> bool {
    text.chars().any(|c| c.is_control() && c != '\n' || c == '\u{202e}')
}

fn texts_of_a_scene_or_a_suite_steer_no_terminal() {
    let folder = workplace();
    let scene = fs::read_to_string(folder.path().join("slab.toml")).unwrap();
    let (_, rest) = scene.split_once("title").unwrap();
    let (_, rest) = rest.split_once('\n').unwrap();
    fs::write(folder.path().join("hostile.toml"), format!("title = \"{HOSTILE}\"\n{rest}")).unwrap();
    // The files of its report: src/report/tests.rs.
    let suite = format!(
        "title = \"{HOSTILE}\"\n[[claim]]\nid = \"={HOSTILE}\"\nstatement = \"{HOSTILE}\"\n\
         check = {{ agreement = {{}} }}\nscenes = [\"slab.toml\"]\nmethods = [\"taylor\"]\nquantities = [\"depth\"]\n\
         limit = 1e-300\nreason = \"{HOSTILE}\"\n"
    );
    fs::write(folder.path().join("suite.toml"), suite).unwrap();
    for line in [
        "verify suite.toml --out report",
        "solve hostile.toml --explain --sensitivities",
        "critical hostile.toml",
        "converge hostile.toml --points 8",
        "sweep hostile.toml --vary H/d=1:5:3 --out out.csv",
        "solve \u{1b}[31m.toml",
        "batch \u{1b}[31m.csv --out out.csv",
        "audit \u{1b}[31m.csv",
        "experiments \u{1b}[31m.csv",
        "verify \u{1b}[31m.toml",
        "solve slab.toml --trajectory \u{1b}[31m/out.csv",
        "sweep slab.toml --vary \u{1b}[31m=1:2:3",
    ] {
        let said = run_in(folder.path(), line);
        assert!(!steers(&said.out) && !steers(&said.err), "{said:?}");
    }
    // JSON keeps the title as it is, its control characters written as escapes.
    let answer = run_in(folder.path(), "solve hostile.toml --json").json();
    assert!(answer["scene"]["title"].as_str().unwrap().contains("\u{1b}[31m"));
}

pub(crate) fn trials() -> Vec<Trial> {
    let can_mount = SmallDisk::new().is_some();
    macro_rules! trial {
        ($claim:ident) => {
            Trial::test(stringify!($claim), || {
                $claim();
                Ok(())
            })
        };
    }
    #[cfg_attr(not(target_os = "linux"), expect(unused_mut, reason = "more trials on Linux"))]
    let mut trials = vec![
        trial!(an_input_is_never_replaced),
        trial!(no_output_has_the_name_of_a_scene),
        trial!(what_cannot_be_written_says_why_and_leaves_nothing),
        trial!(a_report_goes_into_a_new_an_empty_or_its_own_folder_alone),
        trial!(a_table_may_go_to_standard_output),
        trial!(a_reader_that_goes_away_is_no_error),
        trial!(an_interrupted_run_leaves_the_old_results_or_none),
        trial!(a_full_disk_leaves_the_old_results).with_ignored_flag(!can_mount),
        trial!(texts_of_a_scene_or_a_suite_steer_no_terminal),
    ];
    #[cfg(target_os = "linux")]
    trials.extend([
        trial!(a_pipe_and_a_broken_link_are_no_files_and_a_link_stays),
        trial!(a_standard_error_that_cannot_be_written_changes_no_exit_code),
        trial!(an_interrupted_run_leaves_nothing_behind),
        trial!(a_signal_that_is_ignored_stays_so),
    ]);
    trials
}
