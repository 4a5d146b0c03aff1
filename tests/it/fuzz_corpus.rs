//! The corpus of the fuzzers, replayed: what they once found, and what steers them, holds on stable.
//!
//! Longer runs: CONTRIBUTING, "Tests".

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::Path;

#[path = "../../fuzz/checks.rs"]
#[expect(clippy::expect_used, clippy::panic, reason = "a fuzz target fails by panicking")]
#[expect(unreachable_pub, reason = "public in the library of the fuzz targets")]
mod checks;

#[test]
fn whatever_is_in_the_corpus_keeps_every_promise() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    for (target, check) in checks::TARGETS {
        let files: Vec<_> = fs::read_dir(corpus.join(target)).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(files.len() >= 5, "{target}: {} files", files.len());
        for path in files {
            println!("{}", path.display());
            check(&fs::read(&path).unwrap());
        }
    }
}

/// The hostile files, too: a scene or a table of one kind is no table of another.
#[test]
fn every_hostile_file_keeps_the_promises_of_every_reader() {
    let hostile = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile");
    for folder in fs::read_dir(hostile).unwrap() {
        for file in fs::read_dir(folder.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            println!("{}", path.display());
            let bytes = fs::read(&path).unwrap();
            for check in [checks::scene, checks::batch, checks::audit] {
                check(&bytes);
            }
        }
    }
}

#[test]
fn polynomials_and_points_of_any_bytes_keep_their_promises() {
    let mut random = fastrand::Rng::with_seed(1);
    for _ in 0..20_000 {
        let length = random.usize(0..14);
        let mut bytes: Vec<u8> = (0..length).map(|_| random.u8(..)).collect();
        // Small numbers meet zero and each other more often.
        if random.bool() {
            for byte in &mut bytes {
                *byte = (*byte % 5).wrapping_sub(2);
            }
        }
        checks::locate(&bytes);
        let points: Vec<u8> = (0..random.usize(0..64)).map(|_| random.u8(..)).collect();
        checks::order(&points);
    }
}
