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

/// A text made of pieces of expressions, of any characters, or of a file of the corpus, with a few changes.
fn spoilt(random: &mut fastrand::Rng, corpus: &[String]) -> String {
    const PIECES: [&str; 30] = [
        "P", "V", "x", "b", "(", ")", "^", "*", "/", "+", "-", ",", "1", ".", "e", "2e3", "1e-999", " ", "sqrt(",
        "max(", "exp", "log", "v1", "pi", "\t", "²", "\u{202e}", "ß", "**", "9e999",
    ];
    let piece = |random: &mut fastrand::Rng| PIECES[random.usize(..PIECES.len())].chars();
    let mut text: Vec<char> = match random.usize(..3) {
        0 => (0..random.usize(..40)).flat_map(|_| piece(random)).collect(),
        1 => (0..random.usize(..30)).map(|_| random.char('\0'..='\u{3000}')).collect(),
        _ => corpus[random.usize(..corpus.len())].chars().collect(),
    };
    for _ in 0..random.usize(..4) {
        let at = random.usize(..=text.len());
        match random.usize(..3) {
            0 => text.splice(at..at, piece(random)).for_each(drop),
            1 if at < text.len() => drop(text.remove(at)),
            _ => text.splice(at..(at + 2).min(text.len()), piece(random)).for_each(drop),
        }
    }
    text.into_iter().collect()
}

/// So many random texts, from `seed`, as expressions.
fn read_texts(seed: u64, texts: usize) {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/expression");
    let files = fs::read_dir(corpus).unwrap().map(|entry| entry.unwrap().path());
    // In one sequence on every machine.
    let files = files.collect::<std::collections::BTreeSet<_>>();
    let corpus: Vec<String> = files.iter().map(|path| fs::read_to_string(path).unwrap()).collect();
    let mut random = fastrand::Rng::with_seed(seed);
    for _ in 0..texts {
        checks::expression(spoilt(&mut random, &corpus).as_bytes());
    }
}

#[test]
fn expressions_of_any_text_keep_their_promises() {
    read_texts(1, 20_000);
}

#[test]
#[ignore = "as long as PENETRODE_SECONDS says, else half a minute"]
fn expressions_of_any_text_keep_their_promises_for_as_long_as_one_likes() {
    let seconds = std::env::var("PENETRODE_SECONDS").map_or(30, |text| text.parse().unwrap());
    let start = std::time::Instant::now();
    let count = (0..).take_while(|seed| {
        read_texts(*seed, 10_000);
        start.elapsed().as_secs() < seconds
    });
    println!("{} texts in {seconds} s", 10_000 * (1 + count.count()));
}
