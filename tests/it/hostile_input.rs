//! Files that are no scenes, suites or tables: each is refused with its place, its cause and a remedy, fast, in little
//! memory, and nothing is written.
//!
//! The files are in `tests/hostile/`, one folder a kind; their messages are in `tests/it/snapshots/`. Review a change
//! with `SNAPSHOTS=overwrite cargo test --test it hostile_input` and `git diff`.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use penetrode::integrators::MethodName;
use snapbox::{Data, assert_data_eq};

use crate::program::{Said, names, program, scene};

/// Address space of the program [KiB]: threads reserve some hundred MiB and use little of it.
const MEMORY_KIB: u32 = 1 << 20;

/// Processor time (s), which is no less than the wall's on one thread, and does not depend on who else is at work.
const SECONDS: u32 = 1;

#[track_caller]
fn assert_snapshot(name: &str, text: String) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/it/snapshots/{name}.txt"));
    assert_data_eq!(text, Data::read_from(&path, None).raw());
}

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile")
}

/// Runs the program in `folder` under the limits of memory and time.
fn run(folder: &Path, line: &str) -> Said {
    let limited = program(folder, line);
    let mut command = Command::new("sh");
    command.arg("-c").arg(format!("ulimit -v {MEMORY_KIB}; ulimit -t {SECONDS}; exec \"$0\" \"$@\""));
    command.arg(limited.get_program()).args(limited.get_args()).current_dir(folder).output().unwrap().into()
}

/// A folder with a scene in it, for what its command needs besides.
fn folder_with_a_scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(scene("paper-slab"), folder.path().join("slab.toml")).unwrap();
    folder
}

/// What the program says of `bytes` in a file `name`, `{}` in `line` being the file; nothing else happens.
fn refusal_of(name: &str, bytes: &[u8], line: &str) -> String {
    let folder = folder_with_a_scene();
    fs::write(folder.path().join(name), bytes).unwrap();
    let before = names(folder.path());
    let said = run(folder.path(), &line.replace("{}", name));
    said.refused();
    assert_eq!(names(folder.path()), before, "{name}: something was written");
    assert!(!said.err.chars().any(|c| c.is_control() && c != '\n'), "{name}: {said:?}");
    assert!(said.err.len() < 4000, "{name}: {} bytes of message", said.err.len());
    said.err
}

/// The refusals of all files of `kind`, by name.
fn refusals(kind: &str, line: &str) -> String {
    let folder = corpus().join(kind);
    let mut all = String::new();
    for name in names(&folder) {
        let said = refusal_of(&name, &fs::read(folder.join(&name)).unwrap(), line);
        writeln!(all, "== {name}\n{said}").unwrap();
    }
    all
}

#[test]
fn a_bad_file_is_refused_at_its_place() {
    let count: usize = names(&corpus()).iter().map(|kind| names(&corpus().join(kind)).len()).sum();
    assert!(count >= 80, "{count}");
    // A method more is no other refusal.
    let every_method = MethodName::ALL.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    for (snapshot, kind, line) in [
        ("scenes", "scene", "solve {} --trajectory out.csv"),
        ("suites", "suite", "verify {} --out report"),
        ("batch_tables", "batch", "batch {} --out out.csv"),
        // Nothing is on standard output either, not even the names of the columns.
        ("batch_tables", "batch", "batch {} --out -"),
        ("audit_tables", "audit", "audit {}"),
        ("measured_points", "points", "sweep slab.toml --vary H/d=1:5:3 --data {} --out out.csv"),
        ("experiments", "experiments", "experiments {} --out out.csv"),
    ] {
        assert_snapshot(snapshot, refusals(kind, line).replace(&every_method, "(every method)"));
    }
}

/// The table that gives the force of a stage is refused in itself, at its own place.
#[test]
fn a_bad_table_of_a_force_is_refused_at_its_place() {
    assert_snapshot("force_tables", refusals_of_force("force_tables", "x = \"depth_mm\""));
    assert_snapshot("speed_tables", refusals_of_force("speed_tables", "V = \"speed_m_s\""));
}

/// What is said of each table of a force in the folder `kind`, one that goes `over` a column.
fn refusals_of_force(kind: &str, over: &str) -> String {
    let folder = corpus().join(kind);
    let mut all = String::new();
    for name in names(&folder) {
        let place = folder_with_a_scene();
        let text = format!(
            "[projectile]\nmass = \"2 kg\"\n[impact]\nvelocity = \"300 m/s\"\n[[stage]]\n\
             force = {{ table = \"r.csv\", {over}, force = \"force_kN\" }}\n"
        );
        fs::write(place.path().join("scene.toml"), text).unwrap();
        fs::copy(folder.join(&name), place.path().join("r.csv")).unwrap();
        let before = names(place.path());
        let said = run(place.path(), "solve scene.toml --trajectory out.csv");
        said.refused();
        assert_eq!(names(place.path()), before, "{name}: something was written");
        assert!(!said.err.chars().any(|c| c.is_control() && c != '\n'), "{name}: {said:?}");
        assert!(said.err.len() < 4000, "{name}: {} bytes of message", said.err.len());
        writeln!(all, "== {name}\n{}", said.err).unwrap();
    }
    all
}

/// The results say what is wrong with a row that is no scene, and the others are solved: exit code 3.
#[test]
fn a_bad_row_is_reported_in_its_own_line_of_the_results() {
    let kind = corpus().join("rows");
    let mut all = String::new();
    for name in names(&kind) {
        let folder = tempfile::tempdir().unwrap();
        fs::copy(kind.join(&name), folder.path().join(&name)).unwrap();
        let said = run(folder.path(), &format!("batch {name} --out out.csv")).expect(3).err;
        let results = fs::read_to_string(folder.path().join("out.csv")).unwrap();
        assert!(!results.chars().any(|c| c.is_control() && c != '\n'), "{name}: {results:?}");
        write!(all, "== {name}\n{said}").unwrap();
        for row in csv::Reader::from_reader(results.as_bytes()).records() {
            let row = row.unwrap();
            let error = row.iter().next_back().unwrap();
            // A spreadsheet takes a cell that begins so for a formula.
            assert!(!error.starts_with(['=', '+', '-', '@']), "{name}: {error}");
            writeln!(all, "row {}: {}", &row[0], if error.is_empty() { &row[1] } else { error }).unwrap();
        }
        all.push('\n');
    }
    assert_snapshot("batch_rows", all);
}

#[test]
fn a_hundred_megabytes_are_refused_and_not_read() {
    let folder = tempfile::tempdir().unwrap();
    // Holes: 100 MB that need no disk.
    for name in ["big.toml", "big.csv"] {
        fs::File::create(folder.path().join(name)).unwrap().set_len(100 << 20).unwrap();
    }
    // Lines without end would have to be read: the whole of it fits in no megabyte.
    fs::write(folder.path().join("long.csv"), format!("dt_s,depth_m\n{}", "9".repeat(8 << 20))).unwrap();
    let mut all = String::new();
    for line in [
        "solve big.toml",
        "critical big.toml",
        "verify big.toml --out report",
        "audit big.csv",
        "batch big.csv --out out.csv",
        "batch long.csv --out out.csv",
        "sweep big.toml --vary H/d=1:5:3",
        "experiments big.csv",
        "sweep @paper-slab --vary H/d=1:5:3 --data big.csv",
    ] {
        let said = run(folder.path(), line);
        said.refused();
        let shown = if line.contains("--data") { "sweep --data big.csv" } else { line };
        writeln!(all, "== {shown}\n{}", said.err).unwrap();
    }
    assert_eq!(names(folder.path()), ["big.csv", "big.toml", "long.csv"]);
    assert_snapshot("large_files", all);
}

#[test]
fn what_is_no_file_is_refused() {
    let folder = folder_with_a_scene();
    fs::create_dir(folder.path().join("folder")).unwrap();
    let mut all = String::new();
    let points = "sweep slab.toml --vary H/d=1:5:3 --data";
    for command in ["solve", "verify", "audit", "batch --out out.csv", points, "experiments"] {
        // The last is a file that the system refuses to read, also to root.
        for path in ["missing", "folder", "/proc/self/mem"] {
            let said = run(folder.path(), &format!("{command} {path}"));
            said.refused();
            let command = command.split(' ').next().unwrap();
            writeln!(all, "== {command} {path}\n{}", said.err).unwrap();
        }
    }
    assert_eq!(names(folder.path()), ["folder", "slab.toml"]);
    assert_snapshot("no_files", all);
}
