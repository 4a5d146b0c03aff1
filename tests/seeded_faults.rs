//! Does the shipped suite notice when the program is wrong? Each seeded fault must turn a claim red, by name.
//!
//! `faults.toml` lists the faults: a file, the right text, and a wrong text in its place. The test copies the source
//! tree, writes `if active(n) { wrong } else { right }` at each, builds the copy once as `penetrode-faults`, and runs its
//! `verify` and `stress` with one fault after the other. A text that does not stand exactly once in its file fails before
//! the build. A fault is seen where a claim fails or is undecided that held without it, or where a command gives no report.
//!
//! - `FAULTS=list.toml` takes the faults of another list.
//! - `SURVEY=table.tsv` judges every claim under every fault, and writes which tables of claims see it. A fault that has
//!   its line there already is not run again, and one that nobody sees has its line too.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{env, fs, io, thread};

use libtest_mimic::{Arguments, Failed, Trial};
use rayon::prelude::*;
use serde::Deserialize;

/// What the package needs to build: `verification` holds scenes and suites that the library embeds.
const COPIED: [&str; 8] =
    ["Cargo.toml", "Cargo.lock", "build.rs", "src", "tests", "benches", "examples", "verification"];

/// A program with a fault that runs longer than this has none to give.
const PATIENCE: Duration = Duration::from_secs(600);

/// Number of the active fault, from the environment; a copy without it is a healthy program.
const SWITCH: &str = "
/// The seeded fault that this process has, by its number in `tests/faults.toml`.
mod seeded_fault {
    pub(crate) fn active(number: usize) -> bool {
        static ACTIVE: std::sync::OnceLock<Option<usize>> = std::sync::OnceLock::new();
        *ACTIVE.get_or_init(|| std::env::var(\"SEEDED_FAULT\").ok()?.parse().ok()) == Some(number)
    }
}
";

#[derive(Deserialize)]
struct Faults {
    fault: Vec<Fault>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fault {
    id: String,
    /// What is wrong, one clause.
    what: String,
    file: String,
    /// Text that stands once in the file and `right` once in it; absent where `right` stands once in the file.
    within: Option<String>,
    right: String,
    wrong: String,
    #[serde(default)]
    form: Form,
    /// Claims to try first: parts of their ids, separated by `|`, of `stress` where `stress:` stands before one. Then
    /// all are tried.
    claims: Option<String>,
}

/// What the two texts of a fault are.
#[derive(Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Form {
    /// Two expressions of one type.
    #[default]
    Expression,
    /// Statements, none of which declares what is used behind them.
    Statement,
    /// Anything: `wrong` stands in place of `right`, and `ACTIVE` in it says whether the fault is active.
    Text,
}

#[derive(Deserialize)]
struct Run {
    claims: Vec<Claim>,
}

#[derive(Deserialize)]
struct Claim {
    id: String,
    verdict: String,
    measured: Option<f64>,
    limit: Option<f64>,
    remark: String,
    wall_ms: f64,
}

/// The two commands that judge.
#[derive(Clone, Copy, PartialEq)]
enum Judge {
    Verify,
    Stress,
}

impl Judge {
    const ALL: [Self; 2] = [Self::Verify, Self::Stress];

    fn name(self) -> &'static str {
        match self {
            Self::Verify => "verify",
            Self::Stress => "stress",
        }
    }

    /// What the command shows, `fault` active: of all its claims, or of those whose id contains `only`.
    fn run(self, program: &Path, fault: Option<usize>, only: Option<&str>) -> Result<Shown, Box<dyn Error>> {
        let folder = tempfile::tempdir()?;
        let mut command = Command::new(program);
        match (self, only) {
            (Self::Verify, _) => command.arg("verify").args(only.map(|only| format!("--only={only}"))),
            (Self::Stress, None) => command.arg("stress"),
            // `stress` judges all of its claims or none.
            (Self::Stress, Some(only)) => {
                let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/edges.toml");
                command.arg("verify").arg(suite).args(["--only", only])
            }
        };
        command.args(["--json", "--out"]).arg(folder.path().join("report"));
        if let Some(number) = fault {
            command.env("SEEDED_FAULT", number.to_string());
        }
        let [answer, said] = ["answer", "said"].map(|name| folder.path().join(name));
        command.stdout(fs::File::create(&answer)?).stderr(fs::File::create(&said)?).stdin(Stdio::null());
        let mut child = command.spawn()?;
        let started = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if started.elapsed() > PATIENCE {
                child.kill()?;
                child.wait()?;
                return Ok(Shown::Nothing("it did not end".to_owned()));
            }
            thread::sleep(Duration::from_millis(5));
        };
        let said = fs::read(said)?;
        let said = String::from_utf8_lossy(&said);
        Ok(match serde_json::from_slice(&fs::read(answer)?) {
            Ok(Run { claims }) if status.code().is_some_and(|code| code != 1) => Shown::Claims(claims),
            _ => Shown::Nothing(format!("{status}: {}", said.lines().next().unwrap_or_default())),
        })
    }
}

/// What a command showed.
enum Shown {
    Claims(Vec<Claim>),
    /// No report, and why.
    Nothing(String),
}

/// What notices a fault, and by what.
struct Notice {
    /// The table of claims, or the command that gave no report.
    table: String,
    by: String,
}

/// The program with every fault, and how it is without any.
struct Subject {
    program: PathBuf,
    /// Claims that do not hold.
    open: BTreeSet<String>,
    /// Time of each table of claims (ms).
    cost: BTreeMap<String, f64>,
}

impl Subject {
    fn new(program: PathBuf) -> Result<Self, Box<dyn Error>> {
        let mut subject = Self { program, open: BTreeSet::new(), cost: tables()? };
        for judge in Judge::ALL {
            match judge.run(&subject.program, None, None)? {
                Shown::Claims(claims) => {
                    for claim in claims {
                        let table = subject.table(&claim.id);
                        *subject.cost.entry(table).or_default() += claim.wall_ms;
                        if is_open(&claim) {
                            subject.open.insert(claim.id);
                        }
                    }
                }
                Shown::Nothing(why) => return Err(format!("{} without a fault: {why}", judge.name()).into()),
            }
        }
        Ok(subject)
    }

    /// The table whose claim `id` is: ids of tables are the beginnings of ids.
    fn table(&self, id: &str) -> String {
        let mut ends = id.match_indices('/').map(|(at, _)| at).chain([id.len()]).collect::<Vec<_>>();
        ends.reverse();
        let table = ends.into_iter().map(|end| &id[..end]).find(|table| self.cost.contains_key(*table));
        table.unwrap_or(id).to_owned()
    }

    /// Every claim that notices the fault, among those whose id contains `only`.
    fn notices(&self, judge: Judge, fault: usize, only: Option<&str>) -> Result<Vec<Notice>, Box<dyn Error>> {
        Ok(match judge.run(&self.program, Some(fault), only)? {
            Shown::Nothing(why) => vec![Notice { table: judge.name().to_owned(), by: why }],
            Shown::Claims(claims) => {
                let open = claims.into_iter().filter(|claim| is_open(claim) && !self.open.contains(&claim.id));
                open.map(|claim| Notice { table: self.table(&claim.id), by: shown(&claim) }).collect()
            }
        })
    }

    /// Who notices the fault: the first that does of the claims named and of all.
    fn first(&self, number: usize, fault: &Fault) -> Result<Notice, Box<dyn Error>> {
        let named = fault.claims.iter().flat_map(|claims| claims.split('|')).filter(|only| !only.is_empty());
        let named = named.map(|only| match only.strip_prefix("stress:") {
            Some(only) => (Judge::Stress, Some(only)),
            None => (Judge::Verify, Some(only)),
        });
        for (judge, only) in named.chain(Judge::ALL.map(|judge| (judge, None))) {
            if let Some(notice) = self.notices(judge, number, only)?.into_iter().next() {
                return Ok(notice);
            }
        }
        Err(format!("no claim notices: {} ({})", fault.what, fault.file).into())
    }

    /// All that notices the fault, as one line: id, file, what, number of claims, their tables (cheapest first), the first.
    fn survey(&self, number: usize, fault: &Fault) -> Result<String, Box<dyn Error>> {
        let mut notices = Vec::new();
        for judge in Judge::ALL {
            notices.extend(self.notices(judge, number, None)?);
        }
        let cost = |table: &str| self.cost.get(table).copied().unwrap_or_default();
        notices.sort_by(|a, b| cost(&a.table).total_cmp(&cost(&b.table)));
        let mut tables: Vec<&str> = notices.iter().map(|notice| notice.table.as_str()).collect();
        tables.dedup();
        let first = notices.first().map_or_else(|| "nobody", |notice| notice.by.as_str());
        let cells = [&fault.id, &fault.file, &fault.what, &notices.len().to_string(), &tables.join(" "), first];
        Ok(cells.map(|cell| cell.replace(['\t', '\n'], " ")).join("\t"))
    }
}

fn is_open(claim: &Claim) -> bool {
    matches!(claim.verdict.as_str(), "failed" | "undecided")
}

fn shown(Claim { id, verdict, measured, limit, remark, .. }: &Claim) -> String {
    match (measured, limit) {
        (Some(measured), Some(limit)) => format!("{id}: {verdict}, {measured:.2e}, limit {limit:.0e}"),
        _ => format!("{id}: {verdict}, {remark}"),
    }
}

/// The tables of claims of the two suites, each without a cost yet.
fn tables() -> Result<BTreeMap<String, f64>, Box<dyn Error>> {
    #[derive(Deserialize)]
    struct Suite {
        claim: Vec<Table>,
    }
    #[derive(Deserialize)]
    struct Table {
        id: String,
    }
    let mut tables = BTreeMap::new();
    for text in [include_str!("../verification/suite.toml"), include_str!("../verification/edges.toml")] {
        tables.extend(toml::from_str::<Suite>(text)?.claim.into_iter().map(|table| (table.id, 0.0)));
    }
    Ok(tables)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::from_args();
    let list = env::var_os("FAULTS")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults.toml")), PathBuf::from);
    let text = fs::read_to_string(&list).map_err(|error| format!("{}: {error}", list.display()))?;
    let Faults { mut fault } = toml::from_str(&text)?;
    // A fault of a file that this build leaves out cannot show.
    fault.retain(|fault| cfg!(feature = "diffsol") || !fault.file.ends_with("diffsol.rs"));
    if arguments.list {
        let trials = fault.into_iter().map(|fault| Trial::test(fault.id, || Ok(()))).collect();
        libtest_mimic::run(&arguments, trials).exit();
    }
    let subject = Subject::new(build(&fault)?)?;
    if let Some(path) = env::var_os("SURVEY") {
        return survey(&subject, &fault, Path::new(&path));
    }

    let shared = Arc::new((subject, Mutex::new(Vec::new())));
    let context = Arc::clone(&shared);
    let mut trials = vec![Trial::test("without_a_fault_every_claim_holds", move || {
        let open = &context.0.open;
        if open.is_empty() { Ok(()) } else { Err(format!("{open:?}").into()) }
    })];
    trials.extend(fault.into_iter().enumerate().map(|(number, fault)| {
        let context = Arc::clone(&shared);
        Trial::test(fault.id.clone(), move || {
            let (subject, seen) = &*context;
            let by = subject.first(number, &fault).map_err(|error| Failed::from(error.to_string()))?.by;
            let line = format!("{:26} {:38} {:62} {by}", fault.id, fault.file, fault.what);
            seen.lock().unwrap_or_else(PoisonError::into_inner).push(line);
            Ok(())
        })
    }));
    let conclusion = libtest_mimic::run(&arguments, trials);
    for line in shared.1.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        println!("{line}");
    }
    conclusion.exit()
}

/// Adds a line to the table at `path` for each fault that has none there.
fn survey(subject: &Subject, faults: &[Fault], path: &Path) -> Result<(), Box<dyn Error>> {
    let there = fs::read_to_string(path).unwrap_or_default();
    let there: BTreeSet<&str> = there.lines().filter_map(|line| line.split('\t').next()).collect();
    let file = Mutex::new(fs::File::options().create(true).append(true).open(path)?);
    let left: Vec<_> = faults.iter().enumerate().filter(|(_, fault)| !there.contains(fault.id.as_str())).collect();
    println!("{} faults, {} of which are in {} already", faults.len(), faults.len() - left.len(), path.display());
    left.into_par_iter().try_for_each(|(number, fault)| {
        let mut line = subject.survey(number, fault).map_err(|error| format!("{}: {error}", fault.id))?;
        println!("{line}");
        line.push('\n');
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(line.as_bytes()).map_err(|error| error.to_string())
    })?;
    Ok(())
}

/// The copy of the tree with every fault in it, built; returns the program.
fn build(faults: &[Fault]) -> Result<PathBuf, Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("seeded-faults");
    let mut files = Vec::new();
    for name in COPIED {
        list(&root.join(name), &mut files)?;
    }
    let mut kept = BTreeSet::new();
    let (mut texts, mut misfits) = (Vec::new(), String::new());
    for path in files {
        let name = path.strip_prefix(root)?;
        match with_faults(&name.to_string_lossy(), &fs::read_to_string(&path)?, faults) {
            Ok(text) => texts.push((copy.join(name), text)),
            Err(found) => misfits += &found,
        }
    }
    for fault in faults.iter().filter(|fault| !root.join(&fault.file).is_file()) {
        writeln!(misfits, "fault {}: there is no file {}", fault.id, fault.file)?;
    }
    if !misfits.is_empty() {
        return Err(misfits.into());
    }
    for (target, text) in texts {
        // A file that is the same keeps its date, and the second build is short.
        if fs::read_to_string(&target).ok().as_deref() != Some(text.as_str()) {
            fs::create_dir_all(target.parent().unwrap_or(&copy))?;
            fs::write(&target, text)?;
        }
        kept.insert(target);
    }
    let mut present = Vec::new();
    list(&copy, &mut present)?;
    for stray in present.into_iter().filter(|path| !kept.contains(path)) {
        fs::remove_file(stray)?;
    }

    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let features = if cfg!(feature = "diffsol") { "cli,diffsol" } else { "cli" };
    // Dependencies that are built already serve the copy too: same lock file, profile and target folder.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("");
    eprintln!("building the program with {} seeded faults", faults.len());
    let built = Command::new(env!("CARGO"))
        .args(["build", "--locked", "--bin", "penetrode-faults", "--no-default-features"])
        .args(["--features", features, "--profile", profile])
        // Compiled in half the time, and no claim measures speed.
        .args(["--config", "profile.release.package.penetrode-faults.opt-level=1"])
        // An overflow that only a debug build notices would count as seen.
        .args(["--config", "profile.dev.package.penetrode-faults.debug-assertions=false"])
        .args(["--config", "profile.dev.package.penetrode-faults.overflow-checks=false"])
        .env("CARGO_TARGET_DIR", &target)
        .current_dir(&copy)
        .output()?;
    if !built.status.success() {
        let cause = String::from_utf8_lossy(&built.stderr);
        return Err(format!("the copy in {} does not build:\n{cause}", copy.display()).into());
    }
    let folder = if cfg!(debug_assertions) { "debug" } else { "release" };
    Ok(target.join(folder).join("penetrode-faults").with_extension(std::env::consts::EXE_EXTENSION))
}

fn list(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            let path = entry?.path();
            if !path.ends_with("target") && !path.ends_with("hostile") {
                list(&path, files)?;
            }
        }
    } else if path.exists() {
        files.push(path.to_owned());
    }
    Ok(())
}

/// The text of the file `name` in the copy, or what does not fit, a line each.
fn with_faults(name: &str, text: &str, faults: &[Fault]) -> Result<String, String> {
    // Place, order among those of one place, length that is left out, text that is put there.
    let mut edits: Vec<(usize, usize, usize, String)> = Vec::new();
    let mut misfits = String::new();
    for (number, fault) in faults.iter().enumerate().filter(|(_, fault)| fault.file == name) {
        let from = match place(text, fault) {
            Ok(from) => from,
            Err(why) => {
                misfits += &format!("fault {}: {why} in {name}, not once\n", fault.id);
                continue;
            }
        };
        let (wrong, length) = (&fault.wrong, fault.right.len());
        let active = format!("crate::seeded_fault::active({number})");
        let [opening, closing] = match fault.form {
            Form::Text => {
                edits.push((from, usize::MAX, length, wrong.replace("ACTIVE", &active)));
                continue;
            }
            Form::Statement => [format!("if {active} {{ {wrong} }} else {{ "), " }".to_owned()],
            Form::Expression => [format!("(if {active} {{ {wrong} }} else {{ "), " })".to_owned()],
        };
        // Where one right text holds another, the longer opens first and closes last.
        edits.push((from, usize::MAX - length, 0, opening));
        edits.push((from + length, length, 0, closing));
    }
    edits.sort();
    let mut result = String::with_capacity(text.len());
    let mut copied = 0;
    for (at, _, left_out, inserted) in edits {
        match text.get(copied..at) {
            Some(kept) => result += kept,
            None => misfits += &format!("another fault lies inside of `{inserted}` of {name}\n"),
        }
        result += &inserted;
        copied = at + left_out;
    }
    if !misfits.is_empty() {
        return Err(misfits);
    }
    result += &text[copied..];
    match name {
        "src/lib.rs" => result += SWITCH,
        // Another name, so that the copy does not replace the program in the target folder.
        "Cargo.toml" => {
            result = result
                .replacen("name = \"penetrode\"", "name = \"penetrode-faults\"", 1)
                .replace("default-run = \"penetrode\"", "")
                .replace("[lints.rust]", "[lints.rust]\nunused_parens = \"allow\"")
                .replace(
                    "[[bin]]\nname = \"penetrode\"",
                    "[lib]\nname = \"penetrode\"\n\n[[bin]]\nname = \"penetrode-faults\"",
                );
        }
        "Cargo.lock" => result = result.replace("name = \"penetrode\"\n", "name = \"penetrode-faults\"\n"),
        _ => {}
    }
    Ok(result)
}

/// Where the right text of `fault` begins.
fn place(text: &str, fault: &Fault) -> Result<usize, String> {
    let once = |text: &str, part: &str| match text.matches(part).count() {
        1 => Ok(text.find(part).unwrap_or_default()),
        n => Err(format!("`{part}` stands {n} times")),
    };
    match &fault.within {
        Some(within) => Ok(once(text, within)? + once(within, &fault.right)?),
        None => once(text, &fault.right),
    }
}
