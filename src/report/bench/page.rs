//! The page of `bench`.

use maud::{Markup, html};

use super::figures::step_figure_of;
use super::{BenchJson, CaseJson};
use crate::report::figure::{Figure, name_of};
use crate::report::figures::words_for;
use crate::report::page::{Page, Part, Table, cell, figure, folded, number_cell, reproduction, suite_inputs};
use crate::report::text::{clipped, count, number, one_line, power_of_ten};
use crate::report::{Environment, cells, typeset};
use crate::studies::Quantity;
use crate::studies::bench::step_size::{Curve, Held, LEVELS as STEP_LEVELS, StepStudy};
use crate::studies::bench::work_precision::{LEVELS, Run, RunState, by_method, fastest_of, least_error};
use crate::suite::grouped;

/// The page of `report` with its figures.
pub(super) fn to_html(report: &BenchJson, figures: &[Figure]) -> String {
    let e = &report.environment;
    Page {
        title: "What an accuracy costs".into(),
        outcome: "penetrode bench",
        subject: html! {
            @let methods = grouped(&report.runs, |run| run.method.as_str()).len();
            @if methods > 0 { "Measured: error and cost of " (count(methods, "method")) " on " (count(report.scenes.len(), "scene")) "." }
        },
        purpose: &format!("On {}, profile {}.", one_line(&e.cpu), e.profile),
        environment: e,
        parts: Part::of_text(include_str!("../pages/bench.txt"), &|name, _| match name {
            "profile" => profile(e),
            "fastest" => html! { @for case in &report.scenes { (fastest(report, case, figures)) } },
            "steps" => html! { @for study in &report.step_size { (step_size(study, figures)) } },
            "growth" => html! { @if !report.growth.is_empty() { (growth(report, figures)) } },
            "reproduction" => reproduction(e, suite_inputs(e)),
            _ => html! { "@" (name) },
        }),
        files: html! { a href="report.json" { "JSON" } },
    }
    .to_html()
}

fn profile(e: &Environment) -> Markup {
    html! { @if e.profile != "release" {
        p { b { "Built with profile " (e.profile) ": these times are not those of the program." } }
    } }
}

fn figure_named(figures: &[Figure], kind: &str, of: &str) -> Markup {
    let name = name_of(kind, of);
    html! { @for shown in figures.iter().filter(|shown| shown.name == name) { (figure(shown, "")) } }
}

/// Whole microseconds where they are many, else three digits.
fn micro(ns: f64) -> String {
    number(1e-3 * ns, 3)
}

fn fastest(report: &BenchJson, case: &CaseJson, figures: &[Figure]) -> Markup {
    let levels = LEVELS.map(|level| format!("error ≤ {}", power_of_ten(level.log10().round() as i32)));
    let header = ["method".to_owned()].into_iter().chain(levels);
    let header = header.chain(["least error".to_owned(), "not right".to_owned()]);
    let methods = by_method(&report.runs).filter(|runs| runs[0].scene == case.name);
    let table = Table::grid(format!("Fastest runs, {}", one_line(&case.name)), header).rows(methods, fastest_row);
    html! {
        h3 { (one_line(&case.name)) @if let Some(title) = &case.title { ": " (one_line(title)) } }
        @if case.exact < case.problems {
            p.quiet { (count(case.problems - case.exact, "scene")) " without a closed form: measured against a Taylor series
                to round-off." }
        }
        (table)
        (figure_named(figures, "cost", &case.name))
        (all_runs(report, &case.name))
    }
}

fn fastest_row(runs: &[Run]) -> Vec<Markup> {
    let wrong = runs.iter().filter(|run| run.state != RunState::Right).count();
    let mut cells = vec![cell(&runs[0].method)];
    cells.extend(LEVELS.map(|level| {
        html! {
            @if let Some((run, ns)) = fastest_of(runs, level) { (micro(ns)) " " span.quiet { "at " (setting(run)) } }
            @else { "—" }
        }
    }));
    cells.push(number_cell(least_error(runs), 2));
    cells.push(html! { @if wrong > 0 { span.failed { (wrong) " of " (runs.len()) } } @else { "none" } });
    cells
}

/// Its tolerance, or its step with a blank before the unit.
fn setting(run: &Run) -> Markup {
    typeset::html(&run.setting.replace("dt", " dt"))
}

fn all_runs(report: &BenchJson, scene: &str) -> Markup {
    let runs: Vec<&Run> = report.runs.iter().filter(|run| run.scene == scene).collect();
    let header = ["method", "setting", "outcome", "error", "in", "time [µs]", "quartiles [µs]", "evaluations"];
    let dash = || "—".to_owned();
    let table = Table::grid(format!("Every run, {}", one_line(scene)), header).rows(&runs, |run| {
        let quartiles = run.time.map_or_else(dash, |t| format!("{} – {}", micro(t.low_ns), micro(t.high_ns)));
        [
            cell(&run.method),
            setting(run),
            state_cell(run),
            number_cell(run.error, 2),
            cell(run.quantity.map_or("", Quantity::name)),
            cell(run.time.map_or_else(dash, |time| micro(time.median_ns))),
            cell(quartiles),
            number_cell(run.force_evaluations, 4),
        ]
    });
    folded(html! { "Every run of " (one_line(scene)) " (" (runs.len()) ")" }, true, table)
}

fn state_cell(run: &Run) -> Markup {
    let all = run.right + run.undecided + run.failed;
    let class = if run.state == RunState::Failed { "failed" } else { "undecided" };
    html! {
        @if run.state == RunState::Right { "right" } @else {
            span.(class) { (run.state) }
            @if all > 1 { " (" (run.failed) " failed, " (run.undecided) " undecided of " (all) ")" }
            // A reason that fits a cell: the whole one is in the JSON.
            @if let Some(reason) = &run.reason { ": " (clipped(&one_line(reason), 60)) }
        }
    }
}

fn step_size(study: &StepStudy, figures: &[Figure]) -> Markup {
    let title = format!("{}: {}", one_line(&study.scene), words_for(study.quantity));
    let levels = STEP_LEVELS.iter().map(|level| format!("error ≤ {} %", number(100.0 * level, 1)));
    let table = Table::grid(format!("Largest steps, {title}"), ["method".to_owned()].into_iter().chain(levels))
        .rows(&study.curves, |curve| {
            [cell(&curve.method)].into_iter().chain(curve.held.iter().map(|held| held_cell(curve, held)))
        });
    html! { h3 { (title) } (table) (figure_named(figures, "steps", &step_figure_of(study))) }
}

fn held_cell(curve: &Curve, held: &Held) -> Markup {
    html! {
        @if let (Some(size), Some(steps), Some(time)) = (held.size, held.steps, held.time) {
            @if curve.adaptive { "rtol " (number(size, 2)) } @else { (micro(1e9 * size)) " µs" }
            br;
            span.quiet { (count(usize::try_from(steps).unwrap_or(usize::MAX), "step")) ", " (micro(time.median_ns)) " µs" }
        } @else { "none" }
    }
}

fn growth(report: &BenchJson, figures: &[Figure]) -> Markup {
    let table = Table::grid("Cost as work grows, batch by batch", cells::GROWTH);
    let table = table.rows(cells::growth(&report.growth), |row| row.map(cell));
    html! { (table) (figure_named(figures, "growth", "")) }
}
