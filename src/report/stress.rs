//! The folder of `stress` and its page: what is asked of each case and why, then its verdict, method by method.

use std::io;

use maud::{Markup, html};

use super::chart::{Axis, Panel, Style};
use super::figure::Figure;
use super::folder::{Files, files_of};
use super::page::{Page, Table, cell, number_cell, slot};
use super::table::Table as Numbers;
use super::text::one_line;
use super::{Run, StressJson, stability_figures};
use crate::integrators::MethodName;
use crate::studies::extreme_scenes::{Summary, ULPS_MAX};
use crate::suite::{Counts, Evidence, Section, Verdict};

/// Every file of the report.
///
/// # Errors
/// Only what makes memory run out.
pub fn files(run: &Run<'_>) -> io::Result<Files> {
    let figures = figures(run);
    files_of(&StressJson::new(run), to_html(run, &figures), &figures)
}

/// Figures of the run, from the evidence of its cases.
fn figures(run: &Run<'_>) -> Vec<Figure> {
    let mut figures = Vec::new();
    for case in run.judged {
        figures.extend(match &case.evidence {
            Some(Evidence::Boundary(points)) => stability_figures::boundary(points),
            Some(Evidence::Rounding(rows)) => stability_figures::rounding(rows),
            _ => None,
        });
    }
    figures.extend(stiffness(run));
    figures
}

/// Cost over r/M by method: a stage that resists, and one that is driven.
fn stiffness(run: &Run<'_>) -> Option<Figure> {
    let mut table = Numbers::new("case,method,r_over_m_per_s,force_evaluations");
    let mut panels = Vec::new();
    let mut series = Vec::new();
    for (id, title) in [("S11", "a stage that resists"), ("S12", "a driven stage")] {
        for case in run.judged.iter().filter(|case| case.claim.table == id) {
            if let (Some(method), Some(Evidence::Series { points, .. })) = (case.claim.method, &case.evidence) {
                series.push((title, method, points));
                for (rate, cost) in points {
                    table.push([&id, &method, rate, cost]);
                }
            }
        }
    }
    let mut methods: Vec<MethodName> = Vec::new();
    for (_, method, _) in &series {
        if !methods.contains(method) {
            methods.push(*method);
        }
    }
    for title in ["a stage that resists", "a driven stage"] {
        let mut panel = Panel::new(title, Axis::log("r/M", "1/s"), Axis::log("force evaluations", ""));
        for (_, method, points) in series.iter().filter(|(of, ..)| *of == title) {
            // One colour a method, in both panels.
            let index = methods.iter().position(|known| known == method).unwrap_or_default();
            panel = panel.series(method.to_string(), Style::marked_line(index), points.iter().copied());
        }
        panels.push(panel);
    }
    let is_implicit = |method: &MethodName| !matches!(method, MethodName::Taylor | MethodName::Tsit45);
    let implicit = series.iter().any(|(title, method, _)| *title == "a driven stage" && is_implicit(method));
    let message = format!(
        "A stage that resists costs a logarithm more as r/M grows, a driven one in proportion by explicit methods{}",
        if implicit { ", and no more by implicit ones" } else { "" }
    );
    let figure = Figure::new(
        "stiffness",
        Section::Stability,
        message,
        "Force evaluations of a solution at the default tolerance over the fast rate r/M. With a drive against the \
         viscosity the explicit cost grows in proportion; without one, rest comes inside the fast transient.",
        panels,
        table,
    )?;
    Some(figure.sharing_axes())
        // The message is what S11 and S12 claim: where one fails it is not said.
        .filter(|_| {
            run.judged
                .iter()
                .filter(|c| ["S11", "S12"].contains(&c.claim.table.as_str()))
                .all(|c| c.verdict != Verdict::Failed)
        })
}

/// The page of `run` with its figures.
fn to_html(run: &Run<'_>, figures: &[Figure]) -> String {
    Page {
        title: &one_line(&run.suite.title),
        outcome: Counts::of_claims(run.judged).verdict().name(),
        purpose: "Purpose: to show where the program holds at its edges, how far, and what it refuses.",
        environment: &run.environment,
        text: include_str!("pages/stress.txt"),
        slot: &|name, words| match (name, run.random) {
            ("random-scenes", Some((summary, _))) => random_scenes(summary),
            ("random-scenes", None) => html! {},
            _ => slot(run, figures, name, words),
        },
        files: html! { a href="report.json" { "JSON" } },
    }
    .to_html()
}

fn random_scenes(summary: &Summary) -> Markup {
    let outcomes =
        Table::cards("Outcomes, over all scenes that resolve", ["method", "right", "undecided", "refused", "wrong"])
            .numbers(1..5)
            .rows(&summary.tallies, |(method, tally)| {
                [cell(method.name()), cell(tally.right), cell(tally.undecided), cell(tally.refused), cell(tally.wrong)]
            });
    let worst = Table::cards(
        format!(
            "Worst errors in ulp over max(1, condition number), limit {ULPS_MAX}, and the scene that makes each: penetrode \
             stress --show N"
        ),
        ["method", "quantity", "error", "scene"],
    )
    .numbers(2..4)
    .rows(&summary.worst, |((method, quantity), worst)| {
        [cell(method.name()), cell(quantity.name()), number_cell(Some(worst.units), 3), cell(worst.index)]
    });
    html! {
        p { (summary.scenes) " scenes over the whole admissible range, every second one aimed at an edge; "
            (summary.unresolved) " of them do not resolve, 50 digits were asked for " (summary.asked_reference)
            ". Critical velocities: " (summary.critical_found) " agree, " (summary.critical_refused)
            " are out of range and refused." }
        (outcomes)
        (worst)
    }
}
