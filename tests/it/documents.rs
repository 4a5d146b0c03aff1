//! Every document of ours that is cited is in the repository, with the heading that is named; every file can be checked out
//! on every system.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use penetrode::physics::Range;
use penetrode::physics::parameter::{Absence, Entry, Parameter};

use crate::program::{names, run_in};

/// Folders and files in which a document may be cited.
const PLACES: [&str; 17] = [
    "src",
    "tests",
    "benches",
    "examples",
    "fuzz/checks.rs",
    "verification",
    "docs",
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "CITATION.cff",
    ".ci",
    ".github",
    "justfile",
    "deny.toml",
    "SECURITY.md",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file in `path`, but for what is built.
fn files(path: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    if !path.is_dir() {
        found.push(path.to_owned());
    } else if ![".git", "target"].iter().any(|left_out| path.ends_with(left_out)) {
        for entry in fs::read_dir(path)? {
            files(&entry?.path(), found)?;
        }
    }
    Ok(())
}

/// All text in which a document may be cited; comment marks and line breaks are spaces, for a citation may wrap.
fn citing() -> io::Result<Vec<(PathBuf, String)>> {
    let mut paths = Vec::new();
    for place in PLACES {
        files(&root().join(place), &mut paths)?;
    }
    paths.retain(|path| !path.ends_with("documents.rs") && !path.starts_with(root().join("tests/hostile")));
    let mut found = Vec::new();
    for path in paths {
        let Ok(text) = fs::read_to_string(&path) else { continue };
        let bare = text.lines().map(|line| line.trim_start().trim_start_matches(['/', '!', '#', '>', '*', ' ']));
        let text = bare.collect::<Vec<_>>().join(" ");
        found.push((path, text));
    }
    Ok(found)
}

fn headings(document: &str) -> io::Result<Vec<String>> {
    let text = fs::read_to_string(root().join(document))?;
    let marked = text.lines().filter(|line| line.starts_with('#'));
    Ok(marked.map(|line| line.trim_start_matches(['#', ' ']).to_owned()).collect())
}

/// Checks what stands behind each mention of `document`: `cited` gives the start of the heading that it names.
fn all_exist(document: &str, least: usize, cited: impl Fn(&str) -> Option<String>) -> io::Result<()> {
    let headings = headings(&format!("docs/{document}"))?;
    let mut count = 0;
    for (path, text) in citing()? {
        let mentions = text.split(document).skip(1);
        for heading in mentions.filter_map(|rest| cited(rest.trim_start_matches(['`', ')']))) {
            let is_there = headings.iter().any(|known| format!("{known}\n").starts_with(&heading));
            assert!(is_there, "{}: docs/{document} has no heading \"{heading}\"", path.display());
            count += 1;
        }
    }
    assert!(count >= least, "only {count} citations were found: is their form another one?");
    Ok(())
}

#[test]
fn every_cited_section_of_the_theory_and_the_proofs_exists() -> io::Result<()> {
    for (document, least) in [("theory.md", 30), ("enclosures.md", 4)] {
        all_exist(document, least, |rest| {
            let rest = rest.trim_start_matches(['`', ')', ',', ' ']);
            let numbers = rest.strip_prefix("sections ").or_else(|| rest.strip_prefix("section "))?;
            let number: String = numbers.chars().take_while(char::is_ascii_digit).collect();
            Some(format!("{number}. "))
        })?;
    }
    Ok(())
}

#[test]
fn every_cited_heading_of_the_reference_exists() -> io::Result<()> {
    all_exist("reference.md", 10, |rest| Some(format!("{}\n", rest.strip_prefix(", \"")?.split_once('"')?.0)))
}

#[test]
fn no_document_is_cited_that_is_not_here() -> io::Result<()> {
    for (path, text) in citing()? {
        for stray in ["theory section", "theory, section", "the contract", "contract.md"] {
            assert!(!text.contains(stray), "{} cites \"{stray}\"", path.display());
        }
        if path.extension().is_some_and(|extension| extension == "md") {
            // Links to files of ours: `](path)`, with an anchor or without.
            for rest in text.split("](").skip(1) {
                let Some((link, _)) = rest.split_once(')') else { continue };
                let file = link.split('#').next().unwrap_or_default();
                if file.is_empty() || file.contains("://") {
                    continue;
                }
                assert!(path.with_file_name(file).exists(), "{} links to {link}", path.display());
            }
        }
    }
    Ok(())
}

/// A device of Windows, with or without an extension: `nul.toml` cannot be checked out there.
#[test]
fn no_file_name_is_refused_by_windows() -> io::Result<()> {
    let mut paths = Vec::new();
    files(root(), &mut paths)?;
    assert!(paths.len() > 300, "only {} files", paths.len());
    let mut seen = BTreeSet::new();
    for path in paths.iter().filter_map(|path| path.strip_prefix(root()).ok()) {
        for name in path.iter().map(|name| name.to_string_lossy().to_lowercase()) {
            let stem = name.split('.').next().unwrap_or_default();
            let numbered = ["com", "lpt"].iter().find_map(|device| stem.strip_prefix(device));
            let is_device = ["con", "prn", "aux", "nul"].contains(&stem)
                || numbered.is_some_and(|number| number.len() == 1 && number.chars().all(|c| c.is_ascii_digit()));
            assert!(!is_device, "{}: a device of Windows", path.display());
            assert!(!name.ends_with(['.', ' ']), "{}: Windows drops the last character", path.display());
            let refused = |c: char| c.is_control() || "<>:\"/\\|?*".contains(c);
            assert!(!name.contains(refused), "{}: a character that Windows refuses", path.display());
        }
        assert!(seen.insert(path.to_string_lossy().to_lowercase()), "{}: two names in one", path.display());
    }
    Ok(())
}

/// What a terminal shows of each command of the README with an answer behind it, and the file of the scene in it.
#[test]
fn the_commands_of_the_readme_print_what_stands_there() -> io::Result<()> {
    let readme = fs::read_to_string(root().join("README.md"))?;
    // `export` writes a folder.
    let folder = tempfile::tempdir()?;
    let mut commands = 0;
    for block in readme.split("```console\n$ penetrode ").skip(1) {
        let block = block.split("```").next().unwrap_or_default();
        let (line, shown) = block.split_once('\n').unwrap_or_default();
        let said = run_in(folder.path(), line);
        assert_eq!(said.err + &said.out, shown, "penetrode {line}");
        commands += 1;
    }
    assert_eq!(commands, 5);
    let file = run_in(root(), "scenes forrestal-1994-shot-14").out;
    assert!(readme.contains(&format!("```toml\n{}\n```", file.trim_end())), "{file}");
    Ok(())
}

/// `justfile` runs what CONTRIBUTING.md says, to the letter.
#[test]
fn every_recipe_of_the_justfile_is_a_command_of_contributing() -> io::Result<()> {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let contributing = words(&fs::read_to_string(root().join("CONTRIBUTING.md"))?);
    let recipes = fs::read_to_string(root().join("justfile"))?;
    let commands: Vec<_> = recipes.replace("\\\n", "").lines().filter(|l| l.starts_with("    ")).map(words).collect();
    assert!(commands.len() > 10, "{commands:?}");
    for command in commands {
        assert!(contributing.contains(&format!("`{command}`")), "CONTRIBUTING.md has no `{command}`");
    }
    Ok(())
}

#[test]
fn the_reference_gives_each_key_of_a_scene_the_range_and_the_default_of_the_parameter_table() -> io::Result<()> {
    let reference = fs::read_to_string(root().join("docs/reference.md"))?;
    for Entry { path, range, absence, .. } in Parameter::PLAIN.map(Parameter::entry) {
        // A group is no key, and the factor of a nose stands in a table of its own.
        let Some((_, row)) = reference.split_once(&format!("| `{path}` |")) else {
            assert!(!path.contains('.') || path == "projectile.nose.factor", "{path} is missing");
            continue;
        };
        let cells: Vec<_> = row.lines().next().unwrap_or_default().split('|').map(str::trim).collect();
        assert_eq!(cells[1], if range == Range::Positive { "> 0" } else { ">= 0" }, "{path}");
        let is_as_in_the_table = match absence {
            Absence::Refused(_) => cells[2].starts_with("required"),
            Absence::Is(value) => cells[2] == value.to_string(),
            Absence::Means(_) => !cells[2].is_empty() && !cells[2].starts_with("required"),
        };
        assert!(is_as_in_the_table, "{path}: {}", cells[2]);
    }
    Ok(())
}

/// What stands at the top, hidden files apart; and how what builds and commands leave there begins.
const TOP: [&str; 22] = [
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "SECURITY.md",
    "benches",
    "build.rs",
    "deny.toml",
    "docs",
    "examples",
    "fuzz",
    "justfile",
    "python",
    "rustfmt.toml",
    "src",
    "tests",
    "verification",
];
const LEFT_AT_TOP: [&str; 3] = ["target", "penetrode-report", "mutants.out"];

/// A table that a run wrote beside the sources was committed once.
#[test]
fn nothing_lies_at_the_top_that_a_run_left_behind() {
    let strays: Vec<String> = names(root())
        .into_iter()
        .filter(|name| !name.starts_with('.') && !TOP.contains(&name.as_str()))
        .filter(|name| !LEFT_AT_TOP.iter().any(|left| name.starts_with(left)))
        .collect();
    assert_eq!(strays, [""; 0], "left by a run, or to be named in this test");
}
