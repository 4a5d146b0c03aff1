//! What the tests depend on leaves the library as it is built for its users.

use std::collections::BTreeSet;
use std::io;
use std::process::Command;

/// Each package that the default build needs by `edges`, with its features.
fn packages(edges: &str) -> io::Result<BTreeSet<String>> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["tree", "--locked", "--offline", "--prefix", "none", "--format", "{p} {f}", "--edges", edges]);
    let output = cargo.current_dir(env!("CARGO_MANIFEST_DIR")).output()?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    Ok(lines.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect())
}

/// One more feature of a small dependency, and faer, diffsol and the library are built twice: four minutes of a processor.
#[test]
fn a_test_build_changes_no_feature_of_a_dependency() -> io::Result<()> {
    let (library, tests) = (packages("normal,build")?, packages("normal,build,dev")?);
    let changed: Vec<_> = library.difference(&tests).collect();
    assert!(library.len() > 100 && changed.is_empty(), "built again with other features: {changed:#?}");
    Ok(())
}
