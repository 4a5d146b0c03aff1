//! The stress cases pass, random scenes show no defect, and scenes that once made one stay flown.
#![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::path::Path;

use penetrode::physics::Scene;
use penetrode::studies::extreme_scenes::{self, Fate};
use penetrode::suite::Verdict;
use penetrode::suite::stress::{self, JudgedCase};

#[test]
fn every_stress_case_passes_for_every_method_that_this_build_has() {
    let judged = stress::run(1, &|_| {});
    let bad: Vec<&JudgedCase> =
        judged.iter().filter(|case| !matches!(case.verdict, Verdict::Passed | Verdict::Skipped)).collect();
    assert!(bad.is_empty(), "{bad:#?}");
    let passed = judged.iter().filter(|case| case.verdict == Verdict::Passed).count();
    assert!(passed > 60, "{passed}");
    // Only a method that is not built, or that has no viscosity, may be left out.
    for case in judged.iter().filter(|case| case.verdict == Verdict::Skipped) {
        assert!(case.remark.contains("leaves out") || case.remark.contains("cannot treat"), "{case:?}");
    }
}

#[test]
fn random_scenes_over_the_whole_range_show_no_defect() {
    let summary = extreme_scenes::run(4000, 7, &|| {});
    assert_eq!(summary.defects, []);
    assert_eq!(summary.scenes, 4000);
}

/// Each file says in its first line what it once showed.
#[test]
fn scenes_that_once_showed_a_defect_show_none() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions");
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 8, "{}", files.len());
    for file in files {
        let scene = Scene::read(&file).unwrap();
        let seen = extreme_scenes::examine(&scene);
        assert_eq!(seen.defects, Vec::<String>::new(), "{}", file.display());
        assert_eq!(seen.fates.len(), extreme_scenes::METHODS.len(), "{}", file.display());
        assert!(seen.fates.iter().all(|fate| matches!(fate, Fate::Right | Fate::Undecided)), "{}", file.display());
        assert!(fs::read_to_string(&file).unwrap().starts_with("# "), "{}", file.display());
    }
}
