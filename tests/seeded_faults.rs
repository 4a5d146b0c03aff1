//! Does the shipped suite notice when the program is wrong? Each seeded fault must turn a claim red, by name.
//!
//! `faults.toml` lists the faults: a file, the right text, and a wrong text in its place. The test copies the source
//! tree, writes `if active(n) { wrong } else { right }` at each, builds the copy once as `penetrode-faults`, and runs its
//! `verify` and `stress` with one fault after the other. A text that does not stand exactly once in its file fails before
//! the build. A fault is seen where a claim fails or is undecided that held without it, or where a command gives no report.
//!
//! That takes four minutes: `-- --ignored` asks for it, as `.ci/run` does.
//!
//! `verification/seeded_faults.toml` records which tables of claims notice each fault, and those are tried.
//! `SNAPSHOTS=overwrite` renews the records of the faults that are asked for. `FAULTS=list.toml SURVEY=table.tsv` takes the
//! faults of another list, and adds a line for each that has none in the table: what notices, or nobody. Both judge the
//! tables that take little time, and where fewer than [`ENOUGH`] of them notice, all claims.

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
use penetrode::suite::{SeededFault, Suite, seeded_faults};
use rayon::prelude::*;
use serde::Deserialize;

/// What the package needs to build: `verification` holds scenes and suites that the library embeds.
const COPIED: [&str; 9] =
    ["Cargo.toml", "Cargo.lock", "build.rs", "src", "docs", "tests", "benches", "examples", "verification"];

/// A program with a fault that runs longer than this has no report to give. All claims take it a minute and a half beside others.
const PATIENCE: Duration = Duration::from_secs(300);

/// Tables of claims that are recorded for a fault; where as many notice, no others are asked.
const ENOUGH: usize = 5;

/// Claims about the other claims of a suite.
const ABOUT_ALL: [&str; 3] = ["self/counts", "self/measured", "self/independent"];

/// A table that takes less than this part of the time of all is a quick one. Eight in ten are, in an eighth of the time.
const QUICK: f64 = 0.01;

/// The record, in the source tree.
const RECORD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/verification/seeded_faults.toml");

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
struct Report {
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

/// The commands that judge, and a suite of some of their tables.
#[derive(Clone, Copy)]
enum Judge<'a> {
    Verify,
    Stress,
    Tables(&'a [&'a str]),
}

impl Judge<'_> {
    const ALL: [Judge<'static>; 2] = [Judge::Verify, Judge::Stress];

    fn name(self) -> &'static str {
        match self {
            Self::Verify | Self::Tables(_) => "verify",
            Self::Stress => "stress",
        }
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
    /// The tables of both suites, by their ids.
    tables: BTreeMap<String, toml::Value>,
    /// The table of each claim, by the id of the claim.
    table_of: BTreeMap<String, String>,
    /// Claims that do not hold.
    open: BTreeSet<String>,
    /// Time of each table of claims (ms).
    cost: BTreeMap<String, f64>,
}

impl Subject {
    fn new(program: PathBuf) -> Result<Self, Box<dyn Error>> {
        let (mut tables, mut table_of) = (BTreeMap::new(), BTreeMap::new());
        for suite in [Suite::embedded()?, Suite::edges()?] {
            let text: toml::Table = toml::from_str(&suite.text)?;
            for table in text["claim"].as_array().into_iter().flatten() {
                tables.insert(table["id"].as_str().unwrap_or_default().to_owned(), table.clone());
            }
            table_of.extend(suite.claims.into_iter().map(|claim| (claim.id, claim.table)));
        }
        let mut subject = Self { program, tables, table_of, open: BTreeSet::new(), cost: BTreeMap::new() };
        for judge in Judge::ALL {
            subject.add_healthy(judge)?;
        }
        let quick: Vec<String> = subject.quick().into_iter().map(str::to_owned).collect();
        subject.add_healthy(Judge::Tables(&quick.iter().map(String::as_str).collect::<Vec<_>>()))?;
        Ok(subject)
    }

    fn run(&self, judge: Judge<'_>, fault: Option<usize>) -> Result<Shown, Box<dyn Error>> {
        let folder = tempfile::tempdir()?;
        let mut command = Command::new(&self.program);
        command.arg(judge.name()).args(["--json", "--out"]).arg(folder.path().join("report"));
        if let Judge::Tables(ids) = judge {
            let claims = ids.iter().filter_map(|id| self.tables.get(*id).cloned()).collect::<Vec<_>>();
            let suite = toml::Table::from_iter([
                ("title".to_owned(), "some of its tables".into()),
                ("claim".to_owned(), claims.into()),
            ]);
            let path = folder.path().join("suite.toml");
            fs::write(&path, toml::to_string(&suite)?)?;
            command.arg(path);
        }
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
            Ok(Report { claims }) if matches!(status.code(), Some(0 | 3 | 4)) => Shown::Claims(claims),
            _ => Shown::Nothing(format!("{status}: {}", said.lines().next().unwrap_or_default())),
        })
    }

    /// Notes what `judge` shows of the program without a fault.
    fn add_healthy(&mut self, judge: Judge<'_>) -> Result<(), Box<dyn Error>> {
        match self.run(judge, None)? {
            Shown::Claims(claims) => {
                for claim in claims {
                    if !matches!(judge, Judge::Tables(_)) {
                        *self.cost.entry(self.table(&claim.id)).or_default() += claim.wall_ms;
                    }
                    if is_open(&claim) {
                        self.open.insert(claim.id);
                    }
                }
                Ok(())
            }
            Shown::Nothing(why) => Err(format!("{} without a fault: {why}", judge.name()).into()),
        }
    }

    /// The tables that take little time.
    fn quick(&self) -> Vec<&str> {
        let most = QUICK * self.cost.values().sum::<f64>();
        let tables = self.tables.keys().map(String::as_str);
        // Claims about all the others have nothing to say of some.
        tables.filter(|table| self.cost(table) < most && !ABOUT_ALL.contains(table)).collect()
    }

    fn cost(&self, table: &str) -> f64 {
        self.cost.get(table).copied().unwrap_or_default()
    }

    /// The table of the claim `id`.
    fn table(&self, id: &str) -> String {
        self.table_of.get(id).map_or(id, String::as_str).to_owned()
    }

    /// What notices the fault.
    fn notices(&self, judge: Judge<'_>, fault: usize) -> Result<Vec<Notice>, Box<dyn Error>> {
        Ok(match self.run(judge, Some(fault))? {
            Shown::Nothing(why) => vec![Notice { table: judge.name().to_owned(), by: why }],
            Shown::Claims(claims) => {
                let open = claims.into_iter().filter(|claim| is_open(claim) && !self.open.contains(&claim.id));
                open.map(|claim| Notice { table: self.table(&claim.id), by: shown(&claim) }).collect()
            }
        })
    }

    /// The first that notices the fault: of the tables recorded, one after the other, then of all.
    fn first(&self, number: usize, fault: &Fault, record: Option<&SeededFault>) -> Result<Notice, Box<dyn Error>> {
        let recorded: Vec<&str> = record.iter().flat_map(|record| &record.noticed_by).map(String::as_str).collect();
        // The quickest stands first: the others are asked where it does not notice.
        let some = recorded.iter().filter(|table| self.tables.contains_key(**table) && !ABOUT_ALL.contains(table));
        for judge in some.map(|table| Judge::Tables(std::slice::from_ref(table))).chain(Judge::ALL) {
            if let Some(notice) = self.notices(judge, number)?.into_iter().next() {
                if record.is_none() || recorded.contains(&notice.table.as_str()) {
                    return Ok(notice);
                }
                let help = format!("SNAPSHOTS=overwrite cargo test --test seeded_faults -- {}", fault.id);
                return Err(format!("not {recorded:?} notices, but {}; renew the record: {help}", notice.by).into());
            }
        }
        Err(format!("no claim notices: {} ({})", fault.what, fault.file).into())
    }

    /// What notices the fault: how many claims, their tables, the quickest first, and what the first of them saw.
    fn survey(&self, number: usize) -> Result<(usize, Vec<String>, String), Box<dyn Error>> {
        let mut notices = Vec::new();
        let mut tables: Vec<String> = Vec::new();
        for judges in [&[Judge::Tables(&self.quick())][..], &Judge::ALL] {
            if tables.len() >= ENOUGH {
                break;
            }
            notices.clear();
            for judge in judges {
                notices.extend(self.notices(*judge, number)?);
            }
            let cost = |notice: &Notice| self.cost(&notice.table);
            notices.sort_by(|a, b| cost(a).total_cmp(&cost(b)).then_with(|| a.table.cmp(&b.table)));
            tables = notices.iter().map(|notice| notice.table.clone()).collect();
            tables.dedup();
        }
        let first = notices.first().map_or_else(|| "nobody".to_owned(), |notice| notice.by.clone());
        Ok((notices.len(), tables, first))
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

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::from_args();
    let list =
        env::var("FAULTS").unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults.toml").to_owned());
    let text = fs::read_to_string(&list).map_err(|error| format!("{list}: {error}"))?;
    let Faults { mut fault } = toml::from_str(&text)?;
    // A fault of a file that this build leaves out cannot show.
    fault.retain(|fault| cfg!(feature = "diffsol") || !fault.file.ends_with("diffsol.rs"));
    if arguments.list {
        let trials = fault.into_iter().map(|fault| Trial::test(fault.id, || Ok(()))).collect();
        libtest_mimic::run(&arguments, trials).exit();
    }
    let table = env::var("SURVEY").ok();
    let renews = env::var("SNAPSHOTS").is_ok_and(|value| value == "overwrite");
    if table.is_none() && !renews && !arguments.ignored && !arguments.include_ignored {
        // Nobody waits for the build of a copy who has not asked for it.
        let fits = Trial::test("the_text_of_each_fault_stands_once_in_its_file", move || {
            copies(&fault).map(drop).map_err(|error| Failed::from(error.to_string()))
        });
        let none = Trial::test("four minutes: -- --ignored", || Ok(())).with_ignored_flag(true);
        libtest_mimic::run(&Arguments::default(), vec![fits, none]).exit();
    }
    let subject = Subject::new(build(&fault)?)?;
    if let Some(path) = table {
        return survey(&subject, &fault, Path::new(&path));
    }
    if renews {
        return renew(&subject, &fault, arguments.filter.as_deref().unwrap_or_default());
    }

    let records: BTreeMap<String, SeededFault> = records()?;
    let shared = Arc::new((subject, records, Mutex::new(Vec::new())));
    let context = Arc::clone(&shared);
    let mut trials = vec![
        Trial::test("without_a_fault_every_claim_holds", move || {
            let open = &context.0.open;
            if open.is_empty() { Ok(()) } else { Err(format!("{open:?}").into()) }
        })
        .with_ignored_flag(true),
    ];
    trials.extend(fault.into_iter().enumerate().map(|(number, fault)| {
        let context = Arc::clone(&shared);
        Trial::test(fault.id.clone(), move || {
            let (subject, records, seen) = &*context;
            let first = subject.first(number, &fault, records.get(&fault.id));
            let by = first.map_err(|error| Failed::from(error.to_string()))?.by;
            let line = format!("{:26} {:38} {:62} {by}", fault.id, fault.file, fault.what);
            seen.lock().unwrap_or_else(PoisonError::into_inner).push(line);
            Ok(())
        })
        .with_ignored_flag(true)
    }));
    let conclusion = libtest_mimic::run(&arguments, trials);
    for line in shared.2.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        println!("{line}");
    }
    conclusion.exit()
}

/// The records by the id of the fault.
fn records() -> Result<BTreeMap<String, SeededFault>, Box<dyn Error>> {
    Ok(seeded_faults()?.into_iter().map(|fault| (fault.id.clone(), fault)).collect())
}

/// Adds a line to the table at `path` for each fault that has none there: id, file, what, number of claims, their tables,
/// what the quickest of them saw.
fn survey(subject: &Subject, faults: &[Fault], path: &Path) -> Result<(), Box<dyn Error>> {
    let there = fs::read_to_string(path).unwrap_or_default();
    let there: BTreeSet<&str> = there.lines().filter_map(|line| line.split('\t').next()).collect();
    let file = Mutex::new(fs::File::options().create(true).append(true).open(path)?);
    let left: Vec<_> = faults.iter().enumerate().filter(|(_, fault)| !there.contains(fault.id.as_str())).collect();
    println!("{} faults, {} of which are in {} already", faults.len(), faults.len() - left.len(), path.display());
    left.into_par_iter().try_for_each(|(number, Fault { id, file: of, what, .. })| {
        let (count, tables, first) = subject.survey(number).map_err(|error| format!("{id}: {error}"))?;
        let cells = [id, of, what, &count.to_string(), &tables.join(" "), &first];
        let line = cells.map(|cell| cell.replace(['\t', '\n'], " ")).join("\t");
        println!("{line}");
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        writeln!(file, "{line}").map_err(|error| error.to_string())
    })?;
    Ok(())
}

/// Renews the records of the faults whose id contains `only`, or one of its parts between commas, and leaves out those of faults that are no more.
fn renew(subject: &Subject, faults: &[Fault], only: &str) -> Result<(), Box<dyn Error>> {
    let known = records()?;
    let is_asked = |id: &str| only.split(',').any(|part| id.contains(part));
    let renewed = faults.par_iter().enumerate().map(|(number, Fault { id, what, file, .. })| {
        let noticed_by = if let Some(record) = known.get(id).filter(|_| !is_asked(id)) {
            record.noticed_by.clone()
        } else {
            let (_, mut tables, first) = subject.survey(number).map_err(|error| format!("{id}: {error}"))?;
            println!("{id}: {first}");
            tables.truncate(ENOUGH);
            tables
        };
        // A fault may have moved since it was judged.
        Ok(SeededFault { id: id.clone(), what: what.clone(), file: file.clone(), noticed_by })
    });
    let renewed: Vec<SeededFault> = renewed.collect::<Result<_, String>>()?;
    let mut text =
        "# What notices the faults of tests/faults.toml, as tests/seeded_faults.rs measured it (CONTRIBUTING.md).\n\n"
            .to_owned();
    text += "fault = [\n";
    for SeededFault { id, what, file, noticed_by } in renewed {
        // Strings of JSON are strings of TOML.
        let [id, what, file] = [id, what, file].map(serde_json::Value::from);
        let noticed_by = serde_json::to_string(&noticed_by)?;
        writeln!(text, "{{ id = {id}, what = {what}, file = {file}, noticed_by = {noticed_by} }},")?;
    }
    fs::write(RECORD, text + "]\n")?;
    Ok(())
}

/// The files of the copy with every fault in them, by their names in the tree; an error has a line for each text that does not fit.
fn copies(faults: &[Fault]) -> Result<Vec<(PathBuf, String)>, Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for name in COPIED {
        list(&root.join(name), &mut files)?;
    }
    let (mut copies, mut misfits) = (Vec::new(), String::new());
    for path in files {
        let name = path.strip_prefix(root)?;
        match with_faults(&name.to_string_lossy(), &fs::read_to_string(&path)?, faults) {
            Ok(text) => copies.push((name.to_owned(), text)),
            Err(found) => misfits += &found,
        }
    }
    for fault in faults.iter().filter(|fault| !root.join(&fault.file).is_file()) {
        writeln!(misfits, "fault {}: there is no file {}", fault.id, fault.file)?;
    }
    if misfits.is_empty() { Ok(copies) } else { Err(misfits.into()) }
}

/// The copy of the tree with every fault in it, built; returns the program.
fn build(faults: &[Fault]) -> Result<PathBuf, Box<dyn Error>> {
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("seeded-faults");
    let mut kept = BTreeSet::new();
    for (name, text) in copies(faults)? {
        let target = copy.join(name);
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
            Form::Text if !wrong.contains("ACTIVE") => {
                misfits += &format!("fault {}: its text does not ask whether it is ACTIVE\n", fault.id);
                continue;
            }
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
