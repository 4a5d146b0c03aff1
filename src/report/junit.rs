//! `junit.xml`: one test case a claim, for the test views of build servers.
//!
//! A failed claim is a failure. An undecided one is an error, which every such view shows apart from failures and
//! never as a pass: nothing is wrong with what was measured, the measurement could not decide.

use std::time::Duration;

use quick_junit::{NonSuccessKind, Report, SerializeError, TestCase, TestCaseStatus, TestSuite};

use super::Run;
use super::text::one_line;
use crate::suite::{Judged, Verdict};

/// What was judged, for such a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Its name.
    pub name: String,
    /// What it came to.
    pub verdict: Verdict,
    /// Its numbers, in a line; why, where it was skipped.
    pub numbers: String,
    /// All that is said of it.
    pub text: String,
    /// Time (ms).
    pub wall_ms: f64,
}

/// The run as JUnit XML; one suite for each first part of the claims' ids.
///
/// # Errors
/// Only if memory for it cannot be had.
pub fn to_xml(run: &Run<'_>) -> Result<String, SerializeError> {
    let mut report = Report::new(one_line(&run.suite.title));
    for group in run.judged.chunk_by(|a, b| a.claim.group() == b.claim.group()) {
        let cases = group.iter().map(case_of).collect::<Vec<_>>();
        let mut suite = suite_of(group[0].claim.group(), &cases);
        suite.add_property(("seed", run.environment.seed.to_string().as_str()));
        report.add_test_suite(suite);
    }
    report.set_time(duration(run.judged.iter().map(|j| j.wall_ms).sum()));
    report.to_string()
}

/// `cases` as one suite of JUnit XML.
///
/// # Errors
/// Only if memory for it cannot be had.
pub fn of_cases(title: &str, cases: &[Case]) -> Result<String, SerializeError> {
    let mut report = Report::new(one_line(title));
    report.add_test_suite(suite_of(title, cases));
    report.to_string()
}

fn suite_of(name: &str, cases: &[Case]) -> TestSuite {
    let mut suite = TestSuite::new(one_line(name));
    suite.set_time(duration(cases.iter().map(|case| case.wall_ms).sum()));
    suite.add_test_cases(cases.iter().map(|case| test_case(case, name)));
    suite
}

fn case_of(judged: &Judged) -> Case {
    let claim = &judged.claim;
    let measured = judged.measured.map_or_else(|| "nothing".to_owned(), |m| format!("{m:e}"));
    let numbers = format!("measured {measured}, limit {:e} {}", claim.limit, claim.unit_in_words());
    let text = format!("{}\n{numbers}\nwhy this limit: {}\n{}", claim.statement, claim.reason, judged.remark);
    let numbers = if judged.verdict == Verdict::Skipped { judged.remark.clone() } else { numbers };
    Case { name: claim.id.clone(), verdict: judged.verdict, numbers, text, wall_ms: judged.wall_ms }
}

fn test_case(case: &Case, group: &str) -> TestCase {
    let numbers = one_line(&case.numbers);
    let text = case.text.lines().map(one_line).collect::<Vec<_>>().join("\n");
    let open = |kind| {
        let mut status = TestCaseStatus::non_success(kind);
        status.set_type(case.verdict.name()).set_message(&*numbers).set_description(&*text);
        status
    };
    let mut status = match case.verdict {
        Verdict::Passed => TestCaseStatus::success(),
        Verdict::Skipped => TestCaseStatus::skipped(),
        Verdict::Undecided => open(NonSuccessKind::Error),
        Verdict::Failed => open(NonSuccessKind::Failure),
    };
    if case.verdict == Verdict::Skipped {
        status.set_message(numbers);
    }
    let mut test = TestCase::new(one_line(&case.name), status);
    test.set_classname(format!("penetrode.{}", one_line(group))).set_time(duration(case.wall_ms));
    if case.verdict == Verdict::Passed {
        test.set_system_out(text);
    }
    test
}

fn duration(wall_ms: f64) -> Duration {
    Duration::try_from_secs_f64(wall_ms * 1e-3).unwrap_or_default()
}
