//! Every document of ours that is cited is in the repository, with the heading that is named.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Folders and files in which a document may be cited.
const PLACES: [&str; 13] = [
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
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn texts(path: &Path, found: &mut Vec<(PathBuf, String)>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            let path = entry?.path();
            if !path.ends_with("target") && !path.ends_with("hostile") {
                texts(&path, found)?;
            }
        }
    } else if let Ok(text) = fs::read_to_string(path) {
        found.push((path.to_owned(), text));
    }
    Ok(())
}

/// All text in which a document may be cited; comment marks and line breaks are spaces, for a citation may wrap.
fn citing() -> io::Result<Vec<(PathBuf, String)>> {
    let mut found = Vec::new();
    for place in PLACES {
        texts(&root().join(place), &mut found)?;
    }
    found.retain(|(path, _)| !path.ends_with("documents.rs"));
    for (_, text) in &mut found {
        let bare = text.lines().map(|line| line.trim_start().trim_start_matches(['/', '!', '#', '>', '*', ' ']));
        *text = bare.collect::<Vec<_>>().join(" ");
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
fn every_cited_section_of_the_theory_exists() -> io::Result<()> {
    all_exist("theory.md", 30, |rest| {
        let rest = rest.trim_start_matches(['`', ')', ',', ' ']);
        let numbers = rest.strip_prefix("sections ").or_else(|| rest.strip_prefix("section "))?;
        let number: String = numbers.chars().take_while(char::is_ascii_digit).collect();
        Some(format!("{number}. "))
    })
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
