//! The folder of `stress` and its page: what is asked of each case and why, then its verdict, method by method.

use std::io;

use maud::{Markup, html};

use super::folder::{Files, files_of};
use super::page::{Page, Table, cell, slot};
use super::{Run, StressJson, cells, figures, verify_page};
use crate::studies::extreme_scenes::{Summary, ULPS_MAX};

/// Every file of the report.
///
/// # Errors
/// Only what makes memory run out.
pub fn files(run: &Run<'_>) -> io::Result<Files> {
    let figures = figures::all(run);
    let purpose = "Purpose: to show where the program holds at its edges, how far, and what it refuses.";
    let filled = |name: &str, words: &str| match (name, run.random) {
        ("random-scenes", random) => random.map(|(summary, _)| random_scenes(summary)).unwrap_or_default(),
        _ => slot(run, &figures, name, words),
    };
    let files = html! { a href="report.json" { "JSON" } };
    let page = Page::of_run(run, purpose, include_str!("pages/stress.txt"), &filled, files);
    let page = Page { subject: verify_page::subject(run, "case"), ..page };
    files_of(&StressJson::new(run), page.to_html(), &figures)
}

fn random_scenes(summary: &Summary) -> Markup {
    let outcomes = Table::cards("Outcomes, over all scenes that resolve", cells::OUTCOMES).numbers(1..5);
    let caption = format!(
        "Worst errors in ulp over max(1, condition number), limit {ULPS_MAX}, and the scene that makes each: penetrode \
         stress --show N"
    );
    let worst = Table::cards(caption, cells::WORST).numbers(2..4);
    html! {
        p { (summary.scenes) " scenes over the whole admissible range, every second one aimed at an edge; "
            (summary.unresolved) " of them do not resolve, 50 digits were asked for " (summary.asked_reference)
            ". Critical velocities: " (summary.critical_found) " agree, " (summary.critical_refused)
            " are out of range and refused." }
        (outcomes.rows(cells::outcomes(summary), |row| row.map(cell)))
        (worst.rows(cells::worst(summary), |row| row.map(cell)))
    }
}
