//! Records what a report must name: compiler and what it was told, commit, and whether what is built was changed since.

use std::path::Path;
use std::process::Command;

fn main() {
    let run = |program: &str, arguments: &[&str]| {
        Command::new(program)
            .args(arguments)
            .output()
            .ok()
            .filter(|output| output.status.success())
            .and_then(|output| String::from_utf8(output.stdout).ok())
            .map(|text| text.trim().to_owned())
    };
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let set = |name: &str, value: Option<String>| {
        println!("cargo:rustc-env={name}={}", value.unwrap_or_else(|| "unknown".to_owned()));
    };
    set("PENETRODE_RUSTC", run(&rustc, &["--version"]));
    set("PENETRODE_TARGET", std::env::var("TARGET").ok());
    set("PENETRODE_PROFILE", std::env::var("PROFILE").ok());
    // A source package has no repository: the version then has to do.
    set("PENETRODE_COMMIT", run("git", &["rev-parse", "--short=12", "HEAD"]));
    // Lists of flags are parted by a character that no flag holds.
    let flags = std::env::var("CARGO_ENCODED_RUSTFLAGS").ok().map(|flags| flags.replace('\u{1f}', " "));
    set("PENETRODE_RUSTFLAGS", flags.filter(|flags| !flags.is_empty()).or(Some("none".to_owned())));
    set("PENETRODE_TARGET_FEATURES", std::env::var("CARGO_CFG_TARGET_FEATURE").ok());
    set("PENETRODE_OPT_LEVEL", std::env::var("OPT_LEVEL").ok());
    // What goes into the program; documents may differ.
    let built = ["src", "verification", "build.rs", "Cargo.toml", "Cargo.lock"];
    let status = run("git", &[&["status", "--porcelain", "--untracked-files=no", "--"], &built[..]].concat());
    set("PENETRODE_TREE", status.map(|changes| if changes.is_empty() { "clean" } else { "changed" }.to_owned()));
    for path in built {
        println!("cargo:rerun-if-changed={path}");
    }
    // A path that is not there would build the crate anew each time; in a worktree or a source package it is not `.git`.
    for path in ["HEAD", "logs/HEAD"] {
        if let Some(path) = run("git", &["rev-parse", "--git-path", path]).filter(|path| Path::new(path).exists()) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
}
