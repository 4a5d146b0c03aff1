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

#[test]
fn every_cited_section_of_the_theory_exists() -> io::Result<()> {
    let headings = headings("docs/theory.md")?;
    let mut cited = 0;
    for (path, text) in citing()? {
        for rest in text.split("theory.md").skip(1) {
            let rest = rest.trim_start_matches(['`', ')', ',', ' ']);
            let Some(numbers) = rest.strip_prefix("sections ").or_else(|| rest.strip_prefix("section ")) else {
                continue;
            };
            let number: String = numbers.chars().take_while(char::is_ascii_digit).collect();
            assert!(
                headings.iter().any(|heading| heading.starts_with(&format!("{number}. "))),
                "{}: docs/theory.md has no section `{number}`",
                path.display()
            );
            cited += 1;
        }
    }
    assert!(cited >= 30, "only {cited} citations were found: is their form another one?");
    Ok(())
}

#[test]
fn every_cited_heading_of_the_reference_exists() -> io::Result<()> {
    let headings = headings("docs/reference.md")?;
    let mut cited = 0;
    for (path, text) in citing()? {
        for rest in text.split("reference.md").skip(1) {
            let rest = rest.trim_start_matches(['`', ')']);
            let Some((heading, _)) = rest.strip_prefix(", \"").and_then(|quoted| quoted.split_once('"')) else {
                continue;
            };
            assert!(
                headings.iter().any(|known| known == heading),
                "{}: docs/reference.md has no heading \"{heading}\"",
                path.display()
            );
            cited += 1;
        }
    }
    assert!(cited >= 10, "only {cited} citations were found: is their form another one?");
    Ok(())
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
