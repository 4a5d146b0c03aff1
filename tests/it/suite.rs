//! The suite that ships, as a reader of its report sees it: all of it holds, no limit is loose, no seed alarms.

#![expect(clippy::panic, reason = "a test that cannot be set up has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use penetrode::suite::checks::PeerAnswers;
use penetrode::suite::{Counts, Inputs, Judged, LOOSENESS_MAX, Program, Suite, Verdict, looseness, seeded_faults};

/// Seeds of the run for false alarms.
const SEEDS: u64 = 200;

fn run(seed: u64) -> Vec<Judged> {
    judged(&Suite::embedded().unwrap_or_else(|error| panic!("{error}")), seed)
}

fn judged(suite: &Suite, seed: u64) -> Vec<Judged> {
    let peers = PeerAnswers::recorded().unwrap_or_else(|error| panic!("{error}"));
    let program = Program::new(Path::new(env!("CARGO_BIN_EXE_penetrode"))).unwrap_or_else(|error| panic!("{error}"));
    suite.run(Inputs { seed, peers: &peers, program: Some(&program), points: &[] }, &|_| ())
}

/// One line for each claim that did not hold.
fn not_held(judged: &[Judged]) -> Vec<String> {
    judged
        .iter()
        .filter(|judged| !matches!(judged.verdict, Verdict::Passed | Verdict::Skipped))
        .map(|judged| {
            let Judged { claim, verdict, measured, remark, .. } = judged;
            format!("{} {}: {measured:?}, limit {}; {remark}", verdict.name(), claim.id, claim.limit)
        })
        .collect()
}

#[test]
fn every_claim_of_the_shipped_suite_holds_and_no_limit_is_loose() {
    let judged = run(1);
    let counts = Counts::of_claims(&judged);
    assert_eq!(not_held(&judged), [""; 0]);
    assert!(counts.passed >= 60, "{counts:?}");
    // One limit a table: the worst of its claims decides. A loosened limit does not outlive its cause.
    let loose: Vec<_> = looseness(&judged).into_iter().filter(|(_, times)| *times > LOOSENESS_MAX).collect();
    assert_eq!(loose, []);
}

/// It stands alone in a table, in `junit.xml` and in `summary.md`.
#[test]
fn every_statement_is_a_sentence_of_its_own_with_its_subject() {
    for suite in [Suite::embedded(), Suite::edges()] {
        let suite = suite.unwrap_or_else(|error| panic!("{error}"));
        let mut known = BTreeMap::new();
        for claim in &suite.claims {
            let statement = claim.statement.as_str();
            let begins = statement.chars().next().is_some_and(|c| c.is_uppercase() || c.is_ascii_digit() || c == '`');
            assert!(begins && !statement.ends_with('.'), "{}: {statement}", claim.id);
            assert_eq!(*known.entry(statement).or_insert(&claim.table), &claim.table, "{statement}");
        }
    }
}

/// That the tables do notice is the test `seeded_faults`.
#[test]
fn the_record_of_seeded_faults_names_each_of_them_and_claims_that_exist() {
    let listed: toml::Table = toml::from_str(include_str!("../faults.toml")).unwrap_or_else(|error| panic!("{error}"));
    let listed = listed["fault"].as_array().into_iter().flatten();
    let listed: Vec<_> = listed.map(|fault| ["id", "what", "file"].map(|key| fault[key].as_str())).collect();
    let recorded = seeded_faults().unwrap_or_else(|error| panic!("{error}"));
    let named: Vec<_> = recorded.iter().map(|f| [&f.id, &f.what, &f.file].map(|text| Some(text.as_str()))).collect();
    assert_eq!(named, listed);
    let suites = [Suite::embedded(), Suite::edges()].map(|suite| suite.unwrap_or_else(|error| panic!("{error}")));
    let tables = suites.into_iter().flat_map(|suite| suite.claims).map(|claim| claim.table);
    let tables: BTreeSet<_> = tables.chain(["verify", "stress"].map(str::to_owned)).collect();
    for fault in &recorded {
        let lost: Vec<_> = fault.noticed_by.iter().filter(|table| !tables.contains(*table)).collect();
        assert!(!fault.noticed_by.is_empty() && lost.is_empty(), "{}: no table {lost:?}", fault.id);
    }
}

/// `judged` without the claims that are skipped for want of a program or a feature, by family: claims, skipped, cases.
fn families(judged: &[Judged]) -> String {
    let mut families = BTreeMap::<&str, [usize; 3]>::new();
    for judged in judged.iter().filter(|judged| !judged.claim.check.is_last()) {
        let [claims, skipped, cases] = families.entry(judged.claim.group()).or_default();
        *claims += 1;
        *skipped += usize::from(judged.verdict == Verdict::Skipped && !judged.lacks);
        *cases += judged.cases;
    }
    let line = |(name, [claims, skipped, cases]): (&&str, &[usize; 3])| {
        let name = if name.contains(' ') { format!("{name:?}") } else { (*name).to_owned() };
        format!("{name} = {{ claims = {claims}, skipped = {skipped}, cases = {} }}\n", cases * 9 / 10)
    };
    families.iter().map(line).collect()
}

#[test]
fn a_family_of_claims_that_is_lost_or_measured_on_less_fails_the_counts() {
    let suite = |id: &str, cases: usize| {
        let text = format!(
            "title = 'small'\n[[claim]]\nid = 'self/counts'\nstatement = ''\nlimit = 0\nreason = ''\n\
             [claim.check.counted.families]\nnose = {{ claims = 1, skipped = 0, cases = {cases} }}\n\
             [[claim]]\nid = '{id}'\nstatement = ''\nlimit = 1e-14\nreason = ''\ncheck = {{ nose = {{}} }}\n"
        );
        let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let path = folder.path().join("suite.toml");
        fs::write(&path, text).unwrap_or_else(|error| panic!("{error}"));
        let suite = Suite::read(&path.to_string_lossy()).unwrap_or_else(|error| panic!("{error}"));
        not_held(&judged(&suite, 1)).join("")
    };
    assert_eq!(suite("nose/integral", 30), "");
    let lost = suite("other/integral", 30);
    assert!(lost.contains("nose: 0 claims, and the suite counts 1; other: 1 claims, and the suite counts 0"), "{lost}");
    assert!(suite("nose/integral", 1000).contains("cases, and the suite counts 1000"));
}

/// The suites whose claims are counted.
const SUITES: [&str; 2] = ["verification/suite.toml", "verification/edges.toml"];

/// What the claims of `judged` measure, a line each.
fn measurements(judged: &[Judged]) -> String {
    let judged = judged.iter().filter(|judged| !judged.claim.check.is_last());
    let measured = judged.filter_map(|judged| Some((judged, judged.measured?)));
    let line =
        |(judged, measured): (&Judged, f64)| format!("{:?} = [{measured:.3e}, {}]\n", judged.claim.id, judged.cases);
    measured.map(line).collect()
}

/// Writes what the suites count and measure after claims came or went: `cargo test --release --test it write_the_counts -- --ignored`.
#[test]
#[ignore = "changes files of the repository"]
fn write_the_counts() {
    const MARK: &str = "[claim.check.counted.families]\n";
    let mut measured =
        "# What each claim measures, and on how many cases, with the seed 1: written with the counts of the suites.\n"
            .to_owned();
    for (path, suite) in SUITES.iter().zip([Suite::embedded(), Suite::edges()]) {
        let suite = suite.unwrap_or_else(|error| panic!("{error}"));
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{error}"));
        let (before, rest) = text.split_once(MARK).unwrap_or_else(|| panic!("{} has no counts", path.display()));
        let after: String = rest.split_inclusive('\n').skip_while(|line| !line.trim().is_empty()).collect();
        let judged = judged(&suite, 1);
        let text = format!("{before}{MARK}{}{after}", families(&judged));
        fs::write(&path, text).unwrap_or_else(|error| panic!("{error}"));
        measured += &measurements(&judged);
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/measured.toml");
    fs::write(path, measured).unwrap_or_else(|error| panic!("{error}"));
}

/// Ten minutes of one processor: `cargo test --release --test it suite -- --ignored --nocapture`.
#[test]
#[ignore = "200 runs of the suite"]
fn no_seed_raises_a_false_alarm() {
    let seeds = std::env::var("PENETRODE_SEEDS").ok().and_then(|seeds| seeds.parse().ok()).unwrap_or(SEEDS);
    let mut suite = Suite::embedded().unwrap_or_else(|error| panic!("{error}"));
    // What is recorded has seeds of its own, and claims about all others want them all.
    suite.claims.retain(|claim| !claim.id.starts_with("command/recorded/") && !claim.check.is_last());
    let mut alarms = Vec::new();
    let mut tables = std::collections::BTreeMap::<String, (f64, f64, usize)>::new();
    for seed in 1..=seeds {
        let judged = judged(&suite, seed);
        for line in not_held(&judged) {
            println!("seed {seed}: {line}");
            alarms.push(seed);
        }
        for judged in &judged {
            if let Some(measured) = judged.measured {
                let worst = tables.entry(judged.claim.table.clone()).or_insert((0.0, judged.claim.limit, 0));
                worst.0 = worst.0.max(measured);
                worst.2 += 1;
            }
        }
    }
    for (table, (worst, limit, count)) in tables {
        println!("{table:60} worst {worst:9.2e} limit {limit:9.2e} share {:7.4} of {count}", worst / limit);
    }
    assert_eq!(alarms, [0; 0], "of {seeds} seeds");
}
