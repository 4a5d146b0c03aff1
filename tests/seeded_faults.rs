//! Does the shipped suite notice when the program is wrong? Each seeded fault must turn a claim red, by name.
//!
//! `faults.toml` lists the faults: a file, the right text, and a wrong text in its place. The test copies the source
//! tree, writes `if active(n) { wrong } else { right }` at each, builds the copy once as `penetrode-faults`, and runs its
//! `verify` with one fault after the other. A text that does not stand exactly once in its file fails before the build.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::{fs, io};

use libtest_mimic::{Arguments, Failed, Trial};
use serde::Deserialize;

/// What the package needs to build: `verification` holds scenes and suites that the library embeds.
const COPIED: [&str; 8] =
    ["Cargo.toml", "Cargo.lock", "build.rs", "src", "tests", "benches", "examples", "verification"];

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
    /// Claims to try first: parts of their ids, separated by `|`. Then the whole suite is tried.
    claims: String,
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
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::from_args();
    let Faults { mut fault } = toml::from_str(include_str!("faults.toml"))?;
    // A fault of a file that this build leaves out cannot show.
    fault.retain(|fault| cfg!(feature = "diffsol") || !fault.file.ends_with("diffsol.rs"));
    let program = if arguments.list { PathBuf::new() } else { build(&fault)? };
    let healthy: BTreeSet<String> =
        if arguments.list { BTreeSet::new() } else { red(&program, None, "")?.into_iter().map(|c| c.id).collect() };

    let shared = Arc::new((program, healthy, Mutex::new(Vec::new())));
    let context = Arc::clone(&shared);
    let mut trials = vec![Trial::test("without_a_fault_no_claim_fails", move || {
        if context.1.is_empty() { Ok(()) } else { Err(format!("{:?}", context.1).into()) }
    })];
    trials.extend(fault.into_iter().enumerate().map(|(number, fault)| {
        let context = Arc::clone(&shared);
        Trial::test(fault.id.clone(), move || {
            let (program, healthy, seen) = &*context;
            let line = turns_a_claim_red(program, healthy, number, &fault)?;
            seen.lock().unwrap_or_else(PoisonError::into_inner).push(line);
            Ok(())
        })
    }));
    let conclusion = libtest_mimic::run(&arguments, trials);
    for line in shared.2.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        println!("{line}");
    }
    conclusion.exit()
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
    for path in files {
        let name = path.strip_prefix(root)?;
        let target = copy.join(name);
        let text = with_faults(&name.to_string_lossy(), &fs::read_to_string(&path)?, faults)?;
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

/// The text of the file `name` in the copy.
fn with_faults(name: &str, text: &str, faults: &[Fault]) -> Result<String, Box<dyn Error>> {
    let mut insertions: Vec<(usize, usize, String)> = Vec::new();
    for (number, fault) in faults.iter().enumerate().filter(|(_, fault)| fault.file == name) {
        let once = |text: &str, part: &str| match text.matches(part).count() {
            1 => Ok(text.find(part).unwrap_or_default()),
            n => Err(format!("fault {}: `{part}` stands {n} times in {name}, not once", fault.id)),
        };
        let (start, within) = match &fault.within {
            Some(within) => (once(text, within)?, within.as_str()),
            None => (0, text),
        };
        let from = start + once(within, &fault.right)?;
        let to = from + fault.right.len();
        let length = fault.right.len();
        // Where one right text holds another, the longer opens first and closes last.
        let wrong = &fault.wrong;
        insertions.push((
            from,
            usize::MAX - length,
            format!("(if crate::seeded_fault::active({number}) {{ {wrong} }} else {{ "),
        ));
        insertions.push((to, length, " })".to_owned()));
    }
    insertions.sort();
    let mut result = String::with_capacity(text.len());
    let mut copied = 0;
    for (at, _, inserted) in insertions {
        result += &text[copied..at];
        result += &inserted;
        copied = at;
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

/// The claims that fail among those whose id contains `pattern`.
fn red(program: &Path, fault: Option<usize>, pattern: &str) -> Result<Vec<Claim>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(program);
    command.args(["verify", "--json", "--only", pattern, "--out"]).arg(folder.path());
    if let Some(number) = fault {
        command.env("SEEDED_FAULT", number.to_string());
    }
    let output = command.output()?;
    let run: Run = serde_json::from_slice(&output.stdout)
        .map_err(|error| format!("{error}: {}", String::from_utf8_lossy(&output.stderr)))?;
    Ok(run.claims.into_iter().filter(|claim| claim.verdict == "failed").collect())
}

/// Which claim notices `fault`, and what it measured.
fn turns_a_claim_red(
    program: &Path,
    healthy: &BTreeSet<String>,
    number: usize,
    fault: &Fault,
) -> Result<String, Failed> {
    for pattern in fault.claims.split('|').chain([""]) {
        let claims = red(program, Some(number), pattern).map_err(|error| error.to_string())?;
        if let Some(claim) = claims.into_iter().find(|claim| !healthy.contains(&claim.id)) {
            let seen = match (claim.measured, claim.limit) {
                (Some(measured), Some(limit)) => format!("{measured:.2e} > {limit:.0e}"),
                _ => claim.remark,
            };
            return Ok(format!("{:26} {:38} {:62} {}: {seen}", fault.id, fault.file, fault.what, claim.id));
        }
    }
    Err(format!("no claim notices: {} ({})", fault.what, fault.file).into())
}
