//! `junit.xml`: one test case a claim, for the test views of build servers.
//!
//! A failed claim is a failure. An undecided one is an error, which every such view shows apart from failures and
//! never as a pass: nothing is wrong with what was measured, the measurement could not decide.

use std::time::Duration;

use quick_junit::{NonSuccessKind, Report, SerializeError, TestCase, TestCaseStatus, TestSuite};

use super::Run;
use super::text::one_line;
use crate::suite::{Judged, Verdict};

/// The run as JUnit XML; one suite for each first part of the claims' ids.
///
/// # Errors
/// Only if memory for it cannot be had.
pub fn to_xml(run: &Run<'_>) -> Result<String, SerializeError> {
    let mut report = Report::new(one_line(&run.suite.title));
    for group in run.judged.chunk_by(|a, b| a.claim.group() == b.claim.group()) {
        let name = group[0].claim.group();
        let mut suite = TestSuite::new(one_line(name));
        suite.set_time(duration(group.iter().map(|j| j.wall_ms).sum()));
        suite.add_property(("seed", run.environment.seed.to_string().as_str()));
        for judged in group {
            suite.add_test_case(case(judged, name));
        }
        report.add_test_suite(suite);
    }
    report.set_time(duration(run.judged.iter().map(|j| j.wall_ms).sum()));
    report.to_string()
}

fn case(judged: &Judged, group: &str) -> TestCase {
    let claim = &judged.claim;
    let measured = judged.measured.map_or_else(|| "nothing".to_owned(), |m| format!("{m:e}"));
    let numbers = format!("measured {measured}, limit {:e} {}", claim.limit, claim.unit);
    let text = format!(
        "{}\n{numbers}\nwhy this limit: {}\n{}",
        one_line(&claim.statement),
        one_line(&claim.reason),
        one_line(&judged.remark)
    );
    let open = |kind| {
        let mut status = TestCaseStatus::non_success(kind);
        status.set_type(judged.verdict.name()).set_message(&*numbers).set_description(&*text);
        status
    };
    let mut status = match judged.verdict {
        Verdict::Passed => TestCaseStatus::success(),
        Verdict::Skipped => TestCaseStatus::skipped(),
        Verdict::Undecided => open(NonSuccessKind::Error),
        Verdict::Failed => open(NonSuccessKind::Failure),
    };
    if judged.verdict == Verdict::Skipped {
        status.set_message(one_line(&judged.remark));
    }
    let mut case = TestCase::new(one_line(&claim.id), status);
    case.set_classname(format!("penetrode.{}", one_line(group))).set_time(duration(judged.wall_ms));
    if judged.verdict == Verdict::Passed {
        case.set_system_out(text);
    }
    case
}

fn duration(wall_ms: f64) -> Duration {
    Duration::try_from_secs_f64(wall_ms * 1e-3).unwrap_or_default()
}
