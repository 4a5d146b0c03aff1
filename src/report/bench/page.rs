//! The page of `bench`.

use maud::{Markup, html};

use super::BenchJson;
use super::figures::{cost_figure_name, step_figure_name};
use crate::report::figure::Drawn;
use crate::report::figures::words_for;
use crate::report::page::{document, figure, program};
use crate::report::text::{count, number, one_line};
use crate::studies::Quantity;
use crate::studies::bench::step_size::{Curve, Held, LEVELS as STEP_LEVELS};
use crate::studies::bench::work_precision::{LEVELS, Run, RunState};

/// The page of `report` with its figures.
pub(super) fn to_html(report: &BenchJson, figures: &[Drawn]) -> String {
    let e = &report.environment;
    document(
        "What an accuracy costs",
        "penetrode bench: what an accuracy costs",
        html! { a.skip href="#fastest" { "Skip to the fastest" } },
        html! {
            p.quiet { "penetrode " (e.version) ", commit " code { (e.commit) } ", "
                time datetime=(e.date) { (e.date) } ", " (one_line(&e.cpu)) ", profile " (e.profile) "." }
        },
        html! {
            p { "Errors are the same in every run. Times belong to this machine and this hour: they decide no claim, and only
                ratios within one run mean anything." }
            @if e.profile != "release" { p { b { "Built with profile " (e.profile) ": these times are not those of the program." } } }
            (fastest(report, figures))
            (step_size(report, figures))
            (growth(report, figures))
            (reproduction(report))
        },
        html! { "Written by penetrode " (e.version) ". The same numbers: " a href="report.json" { "JSON" }
        ", and a CSV file for each figure." },
    )
}

fn section(id: &str, title: &str, body: &Markup) -> Markup {
    html! { section aria-labelledby=(id) { h2 id=(id) { (title) } (body) } }
}

fn figures_named(figures: &[Drawn], chosen: &dyn Fn(&str) -> bool) -> Markup {
    html! { @for drawn in figures.iter().filter(|drawn| chosen(&drawn.figure.name)) { (figure(drawn, html! {})) } }
}

/// Whole microseconds where they are many, else three digits.
fn micro(ns: f64) -> String {
    number(1e-3 * ns, 3)
}

fn fastest(report: &BenchJson, figures: &[Drawn]) -> Markup {
    if report.runs.is_empty() {
        return html! {};
    }
    let body = html! {
        p { "The fastest run of each method within an error: median time of one flight in µs, and the setting. The error is
            the largest of all quantities over max(1, condition number), against 50 digits. A run counts only if every
            outcome is right. Times of other programs are their own, without reading and writing, and after compilation." }
        @for case in &report.scenes {
            h3 { (one_line(&case.name)) @if let Some(title) = &case.title { ": " (one_line(title)) } }
            @if case.exact < case.problems {
                p.quiet { (count(case.problems - case.exact, "scene")) " without a closed form: measured by a Taylor series to round-off." }
            }
            div.scroll tabindex="0" role="region" aria-label={ "Fastest runs, " (one_line(&case.name)) } {
                table.grid {
                    thead { tr { th scope="col" { "method" }
                        @for level in LEVELS { th scope="col" { "error ≤ " (number(level, 1)) } }
                        th scope="col" { "least error" } th scope="col" { "not right" } } }
                    tbody { @for runs in runs_of(report, &case.name) { (fastest_row(report, runs)) } }
                }
            }
            (figures_named(figures, &|name| name == cost_figure_name(&case.name)))
            (all_runs(report, &case.name))
        }
    };
    section("fastest", "Error against time", &body)
}

/// Runs of a case, method by method.
fn runs_of<'a>(report: &'a BenchJson, scene: &str) -> Vec<&'a [Run]> {
    report
        .runs
        .chunk_by(|a, b| a.scene == b.scene && a.method == b.method)
        .filter(|runs| runs[0].scene == scene)
        .collect()
}

fn fastest_row(report: &BenchJson, runs: &[Run]) -> Markup {
    let right = || runs.iter().filter(|run| run.state == RunState::Right);
    let least = right().filter_map(|run| run.error).min_by(f64::total_cmp);
    html! { tr {
        th scope="row" { (one_line(&runs[0].method)) }
        @for level in LEVELS {
            @let best = report.fastest.iter().find(|f| f.scene == runs[0].scene && f.method == runs[0].method && f.level == level);
            td.num { @match best.and_then(|best| best.time_ns.zip(best.setting.as_ref())) {
                Some((ns, setting)) => { (micro(ns)) " " span.quiet { "at " (setting) } }
                None => "—",
            } }
        }
        td.num { @if let Some(least) = least { (number(least, 2)) } @else { "—" } }
        td.num { @let wrong = runs.len() - right().count();
            @if wrong > 0 { span.failed { (wrong) " of " (runs.len()) } } @else { "none" } }
    } }
}

fn all_runs(report: &BenchJson, scene: &str) -> Markup {
    let runs: Vec<&Run> = report.runs.iter().filter(|run| run.scene == scene).collect();
    html! {
        details {
            summary { "Every run of " (one_line(scene)) " (" (runs.len()) ")" }
            div.scroll tabindex="0" role="region" aria-label={ "Every run, " (one_line(scene)) } {
                table.grid {
                    thead { tr { th scope="col" { "method" } th scope="col" { "setting" } th scope="col" { "outcome" }
                        th scope="col" { "error" } th scope="col" { "in" } th scope="col" { "time [µs]" }
                        th scope="col" { "quartiles [µs]" } th scope="col" { "evaluations" } } }
                    tbody { @for run in runs { tr {
                        th scope="row" { (one_line(&run.method)) }
                        td.num { (run.setting) }
                        td { @if run.state == RunState::Right { "right" } @else {
                            span.(if run.state == RunState::Failed { "failed" } else { "undecided" }) { (run.state.name()) }
                            @if run.right + run.undecided + run.failed > 1 {
                                " (" (run.failed) " failed, " (run.undecided) " undecided of " (run.right + run.undecided + run.failed) ")"
                            }
                            @if let Some(reason) = &run.reason { ": " (short(reason)) }
                        } }
                        td.num { @if let Some(error) = run.error { (number(error, 2)) } @else { "—" } }
                        td { (run.quantity.map_or("", Quantity::name)) }
                        td.num { @if let Some(time) = run.time { (micro(time.median_ns)) } @else { "—" } }
                        td.num { @if let Some(time) = run.time { (micro(time.low_ns)) " – " (micro(time.high_ns)) } @else { "—" } }
                        td.num { @if let Some(evaluations) = run.force_evaluations { (number(evaluations, 4)) } @else { "—" } }
                    } } }
                }
            }
        }
    }
}

/// A reason that fits a cell; the whole one is in the JSON.
fn short(reason: &str) -> String {
    const MOST: usize = 60;
    let line = one_line(reason);
    if line.chars().count() <= MOST { line } else { line.chars().take(MOST).chain(['…']).collect() }
}

fn step_size(report: &BenchJson, figures: &[Drawn]) -> Markup {
    if report.step_size.is_empty() {
        return html! {};
    }
    let body = html! {
        p { "The largest step of each variant of the paper's scheme that holds an error, with its steps and its time. A step
            holds an error only if every smaller one that was tried holds it too; a small error at a lucky step proves
            nothing. Below the variants, what an adaptive method pays for the same: its loosest tolerance that holds the
            error. For the critical velocity, steps and time are those of the whole search." }
        @for study in &report.step_size {
            h3 { (one_line(&study.scene)) ": " (words_for(study.quantity)) }
            div.scroll tabindex="0" role="region" aria-label={ "Largest steps, " (one_line(&study.scene)) ", " (words_for(study.quantity)) } {
                table.grid {
                    thead { tr { th scope="col" { "method" }
                        @for level in STEP_LEVELS { th scope="col" { "error ≤ " (number(100.0 * level, 1)) " %" } } } }
                    tbody { @for curve in &study.curves { tr {
                        th scope="row" { (curve.method) }
                        @for held in &curve.held { td.num { (held_cell(curve, held)) } }
                    } } }
                }
            }
            (figures_named(figures, &|name| name == step_figure_name(study)))
        }
    };
    section("steps", "The paper's scheme against its step", &body)
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

fn growth(report: &BenchJson, figures: &[Drawn]) -> Markup {
    if report.growth.is_empty() {
        return html! {};
    }
    let body = html! {
        p { code { "penetrode batch" } " as a process of its own, its start and end included; the shortest of the runs." }
        div.scroll tabindex="0" role="region" aria-label="Cost as work grows" {
            table.grid {
                thead { tr { th scope="col" { "scenes" } th scope="col" { "source" } th scope="col" { "threads" }
                    th scope="col" { "time [s]" } th scope="col" { "a scene [µs]" } th scope="col" { "peak memory [MB]" } } }
                tbody { @for g in &report.growth { tr {
                    th scope="row" { (g.scenes) } td { (format!("{:?}", g.source).to_lowercase()) } td.num { (g.threads) }
                    td.num { (number(g.seconds, 3)) } td.num { (micro(g.ns_a_scene)) }
                    td.num { @if let Some(bytes) = g.peak_bytes { (number(1e-6 * bytes as f64, 3)) } @else { "—" } }
                } } }
            }
        }
        (figures_named(figures, &|name| name == "growth"))
    };
    section("growth", "Cost as work grows", &body)
}

fn reproduction(report: &BenchJson) -> Markup {
    let e = &report.environment;
    let body = html! {
        pre { code { (one_line(&e.command)) } }
        dl.facts {
            (program(e))
            dt { "Processor" } dd { (one_line(&e.cpu)) ", " (count(e.threads, "thread")) "; flights are timed on one" }
            dt { "Scenes (BLAKE3)" } dd { code { (e.scenes_hash) } }
            @for (name, text) in &e.peers { dt { (one_line(name)) } dd { (one_line(text)) } }
            dt { "Date" } dd { time datetime=(e.date) { (e.date) } }
        }
    };
    section("reproduction", "Reproduction", &body)
}
