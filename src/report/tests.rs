//! The whole folder, from a few real claims and a few hostile ones.

use std::path::Path;
use std::sync::LazyLock;

use super::{Environment, Run, folder};
use crate::suite::checks::{Peer, PeerAnswers, PeerName};
use crate::suite::{Check, Evidence, Inputs, Judged, Suite, Verdict};

const HOSTILE: &str = "=1+1,a\"b'<script>alert(1)</script>&|`*_\n\u{1b}[2J\u{7}\u{202e},=1+1]]> ";

/// A quick part of the suite, judged once; the last claims are hostile, failed and undecided.
static JUDGED: LazyLock<(Suite, Vec<Judged>)> = LazyLock::new(|| {
    let mut suite = Suite::embedded().unwrap();
    let starts = "small-impact/approach peer/ invariant/energy sweep/ map/ measured rounding stability/m";
    suite.claims.retain(|claim| {
        claim.id.starts_with("order/jump") && claim.id.ends_with("/depth")
            || starts.split(' ').any(|start| claim.id.starts_with(start))
    });
    let mut judged =
        suite.run(Inputs { seed: 1, peers: &PeerAnswers::recorded().unwrap(), program: None, points: &[] }, &|_| ());
    for verdict in [Verdict::Failed, Verdict::Undecided, Verdict::Skipped] {
        let mut hostile = judged[0].clone();
        hostile.claim.id = format!("{HOSTILE}/{}", verdict.name());
        hostile.claim.table.clone_from(&hostile.claim.id);
        hostile.claim.statement = HOSTILE.to_owned();
        hostile.claim.reason = HOSTILE.to_owned();
        hostile.claim.scene = Some(HOSTILE.to_owned());
        hostile.remark = HOSTILE.to_owned();
        hostile.verdict = verdict;
        judged.push(hostile);
    }
    let mut peer = judged.iter().find(|j| matches!(j.claim.check, Check::Peer(_))).unwrap().clone();
    peer.claim.check = Check::Peer(Peer { name: PeerName::User, tolerance: 1e-6 });
    peer.measured = Some(0.5);
    judged.push(peer);
    suite.title = HOSTILE.to_owned();
    (suite, judged)
});

fn run<'a>(suite: &'a Suite, judged: &'a [Judged]) -> Run<'a> {
    let environment = Environment::here(1, HOSTILE.to_owned(), suite, vec![(HOSTILE.to_owned(), HOSTILE.to_owned())]);
    Run { suite, judged, environment, points: &[(5.0, 30.0)], random: None }
}

/// The files of a report as text.
fn texts(files: folder::Files) -> Vec<(String, String)> {
    files.into_iter().map(|(name, bytes)| (name, String::from_utf8(bytes).unwrap())).collect()
}

fn files(suite: &Suite, judged: &[Judged]) -> Vec<(String, String)> {
    texts(folder::files(&run(suite, judged)).unwrap())
}

#[test]
fn text_of_others_acts_in_no_file() {
    let (suite, judged) = &*JUDGED;
    for (name, text) in files(suite, judged) {
        let extension = Path::new(&name).extension().unwrap().to_str().unwrap();
        if ["html", "svg", "xml", "md"].contains(&extension) {
            assert!(!text.contains("<script"), "{name}");
            assert!(!text.contains('\u{202e}'), "{name}");
        }
        assert!(!text.contains(['\u{1b}', '\u{7}']), "{name} holds control characters");
        assert_eq!(name.chars().filter(|c| !c.is_ascii_alphanumeric() && !"-./".contains(*c)).count(), 0, "{name}");
        match extension {
            "json" => drop(serde_json::from_str::<serde_json::Value>(&text).unwrap()),
            "csv" => {
                let mut rows = csv::Reader::from_reader(text.as_bytes());
                let rows = rows.records().collect::<Result<Vec<_>, _>>().unwrap();
                assert!(!rows.is_empty(), "{name}");
                // A spreadsheet takes a cell that begins so for a formula.
                let cells = rows.iter().flat_map(|row| row.iter());
                assert_eq!(cells.filter(|cell| cell.starts_with(['=', '@'])).count(), 0, "{name}");
            }
            "xml" => {
                quick_junit::Report::deserialize_from_str(&text).unwrap();
                assert!(!text.contains("]]> "), "raw text in CDATA: {text}");
            }
            _ => {}
        }
    }
}

#[test]
fn reports_of_one_run_differ_in_times_alone() {
    let (suite, judged) = &*JUDGED;
    let slower: Vec<Judged> = judged.iter().cloned().map(|j| Judged { wall_ms: j.wall_ms * 3.0 + 1.0, ..j }).collect();
    let (first, second) = (files(suite, judged), files(suite, &slower));
    let names = |files: &[(String, String)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&first), names(&second));
    for ((name, first), (_, second)) in first.into_iter().zip(second) {
        assert_eq!(without_times(&first), without_times(&second), "{name}");
    }
}

/// Dates, and the times of JSON and JUnit, put out of sight.
fn without_times(text: &str) -> String {
    let mut lines = Vec::new();
    for line in text.lines() {
        // Markdown writes the colons of a date as entities.
        let mut line = line.replace("&#58;", ":");
        for (start, end) in [("\"wall_ms\": ", ""), (" time=\"", "\""), ("datetime=\"", "\"")] {
            while let Some(at) = line.find(start) {
                let rest = &line[at + start.len()..];
                let length = if end.is_empty() { rest.len() } else { rest.find(end).unwrap() };
                line.replace_range(at..at + start.len() + length, "TIME");
            }
        }
        // `2026-11-21T05:09:15Z`, wherever it stands in the line; other Zs stay.
        let dates: Vec<usize> = line
            .match_indices('Z')
            .map(|(at, _)| at)
            .filter(|&at| at >= 19 && line.as_bytes()[at - 9] == b'T' && line.as_bytes()[at - 3] == b':')
            .collect();
        for at in dates.into_iter().rev() {
            line.replace_range(at - 9..=at, "TIME");
        }
        lines.push(line);
    }
    lines.join("\n")
}

#[test]
fn stress_reports_of_one_run_differ_in_times_alone() {
    // A few cases, judged, are enough: those with figures and one that failed.
    let (suite, judged) = (Suite::edges().unwrap(), &JUDGED.1);
    let of = |id: &str, evidence, verdict, wall_ms| Judged {
        claim: suite.claims.iter().find(|claim| claim.id == id).unwrap().clone(),
        verdict,
        measured: Some(0.5),
        resolution: 0.0,
        remark: HOSTILE.to_owned(),
        evidence,
        cases: 1,
        lacks: false,
        wall_ms,
    };
    let figures = judged.iter().filter_map(|j| match &j.evidence {
        Some(evidence @ (Evidence::Boundary(_) | Evidence::Rounding(_))) => Some(evidence.clone()),
        _ => None,
    });
    let figures: Vec<Evidence> = figures.collect();
    assert_eq!(figures.len(), 2);
    let written = |wall_ms: f64| {
        let mut cases = vec![of("E1/taylor", None, Verdict::Failed, wall_ms)];
        cases.extend(figures.iter().map(|figure| of("S1", Some(figure.clone()), Verdict::Passed, wall_ms)));
        texts(super::stress::files(&run(&suite, &cases)).unwrap())
    };
    let (first, second) = (written(1.0), written(2.0));
    assert_eq!(first.len(), 2 + 2 * figures.len());
    for ((name, first), (other, second)) in first.iter().zip(&second) {
        assert_eq!((name, without_times(first)), (other, without_times(second)));
        let acts = first.contains("<script") || first.contains('\u{1b}');
        assert!(!acts || Path::new(name).extension().is_some_and(|e| e == "json"), "{name}");
    }
    assert!(first[1].1.contains("1 of 3 cases that apply do not hold"));
}

#[test]
fn junit_says_what_became_of_each_claim() {
    let (suite, judged) = &*JUDGED;
    let (_, xml) = files(suite, judged).into_iter().find(|(name, _)| name == "junit.xml").unwrap();
    let report = quick_junit::Report::deserialize_from_str(&xml).unwrap();
    let count = |verdict| judged.iter().filter(|j| j.verdict == verdict).count();
    assert_eq!(report.tests, judged.len());
    assert_eq!(report.failures, count(Verdict::Failed));
    assert_eq!(report.errors, count(Verdict::Undecided));
    assert_eq!(report.skipped, count(Verdict::Skipped));
    let failed = xml.split("<failure").nth(1).unwrap();
    for part in ["measured", "limit", "order", "why this limit"] {
        assert!(failed.contains(part), "{part} in {failed:.600}");
    }
}

#[test]
fn a_report_replaces_an_older_one_whole() {
    let (suite, judged) = &*JUDGED;
    let run = run(suite, judged);
    let place = tempfile::tempdir().unwrap();
    // Twice: an empty folder, made by hand, then one of ours in its place, with nothing left over beside it.
    let ours = place.path().join("report");
    std::fs::create_dir(&ours).unwrap();
    for _ in 0..2 {
        folder::write(folder::files(&run), &ours).unwrap();
        // As a report of other claims would have left it: listed, and so replaced.
        std::fs::write(ours.join("figures/old.svg"), "").unwrap();
        let list = std::fs::read_to_string(ours.join("contents.txt")).unwrap();
        std::fs::write(ours.join("contents.txt"), list + "figures/old.svg\n").unwrap();
    }
    folder::write(folder::files(&run), &ours).unwrap();
    assert!(!ours.join("figures/old.svg").exists() && ours.join("figures/observed-orders.svg").exists());
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1);
}

#[test]
fn a_report_never_replaces_what_is_not_its_own() {
    let (suite, judged) = &*JUDGED;
    let run = run(suite, judged);
    for foreign in ["notes.txt", "tables/mine.csv", "figures/deep/mine.svg", "mine", ".hidden"] {
        let place = tempfile::tempdir().unwrap();
        let report = place.path().join("report");
        folder::write(folder::files(&run), &report).unwrap();
        let path = report.join(foreign);
        if foreign == "mine" {
            std::fs::create_dir(&path).unwrap();
        } else {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, "years of work").unwrap();
        }
        let error = folder::write(folder::files(&run), &report).unwrap_err();
        let first = foreign.split("/mine.svg").next().unwrap();
        assert!(matches!(&error, folder::FolderError::NotOurs { why, .. } if why.contains(first)), "{error}");
        assert!(path.exists() && report.join("report.html").exists(), "{foreign}");
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1, "{foreign}");
    }
}

#[test]
fn an_empty_run_has_a_report() {
    let mut suite = Suite::embedded().unwrap();
    suite.claims.clear();
    let html = files(&suite, &[]).into_iter().find(|(name, _)| name == "report.html").unwrap().1;
    assert!(html.contains("Nothing was decided"));
    // A slot without contents of that name would be shown as it is written.
    let (_, main) = html.split_once("<main").unwrap();
    assert_eq!(main.lines().filter(|line| line.starts_with('@')).count(), 0);
}

#[test]
fn a_report_that_cannot_be_made_is_refused_before_the_work() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error = folder::check(&file.join("report"), "verify").unwrap_err();
    assert!(matches!(error, folder::FolderError::Write { .. }), "{error}");
    folder::check(&place.path().join("a/b/report"), "verify").unwrap();
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1);
}

#[test]
fn the_largest_error_is_read_first() {
    let mut suite = Suite::embedded().unwrap();
    suite.claims.retain(|claim| claim.id.starts_with("agreement/taylor"));
    let mut judged = suite.run(Inputs { seed: 1, peers: &PeerAnswers::default(), program: None, points: &[] }, &|_| ());
    let first_screen = |judged: &[Judged]| {
        let page = files(&suite, judged).into_iter().find(|(name, _)| name == "report.html").unwrap().1;
        let head = page.split("<nav").next().unwrap();
        head[head.find("<body").unwrap()..].to_owned()
    };
    assert!(first_screen(&judged).contains("the scene fixes this quantity"));
    let planted = judged.iter().position(|j| j.measured.is_some()).unwrap();
    for (error, shown) in [(0.25, "<b>0.25</b>"), (f64::NAN, "<b>not a number</b>")] {
        judged[planted].measured = Some(error);
        assert!(first_screen(&judged).contains(shown), "{}", first_screen(&judged));
    }
}
