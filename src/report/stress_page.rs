//! The page of the stress cases: what is asked of each and why, then what became of it, method by method.

use maud::{Markup, html};

use super::chart::{Axis, HEIGHT, Ink, Key, KeyPlace, Mark, Panel, Shape};
use super::figure::{Drawn, Figure, Part};
use super::page::{badge, banner, document, figure, measured_of, reproduction, tally};
use super::stability_figures;
use super::stress::StressRun;
use super::table::Table;
use super::text::{number, one_line};
use crate::integrators::MethodName;
use crate::studies::extreme_scenes::{Summary, ULPS_MAX};
use crate::suite::stress::{JudgedCase, counts};
use crate::suite::{Counts, Evidence, Verdict};

/// The kinds of cases by the first letter of their ids, with heading and anchor.
const KINDS: [(char, &str, &str, &str); 3] = [
    (
        'E',
        "events",
        "Events at their edges",
        "Grazing, coincident, at the start, at the end of a step, an ulp apart, none at all: an event is found once, at its \
         place, or the outcome is undecided inside its error bar.",
    ),
    (
        'S',
        "steps",
        "Steps, range, rounding and stiffness",
        "The paper's scheme about its stability limit, every method over the range of the numbers, rounding in three kinds \
         of numbers, and stages that are stiff or only look so.",
    ),
    (
        'V',
        "critical",
        "Critical velocity",
        "The search for it under wrong objectives, without a root, and near its root.",
    ),
];

/// Figures of the run, from the evidence of its cases.
pub(super) fn figures(run: &StressRun<'_>) -> Vec<Figure> {
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
fn stiffness(run: &StressRun<'_>) -> Option<Figure> {
    let mut table = Table::new(["case", "method", "r_over_m_per_s", "force_evaluations"]);
    let mut panels = Vec::new();
    let mut series = Vec::new();
    for (id, title) in [("S11", "a stage that resists"), ("S12", "a driven stage")] {
        for case in run.judged.iter().filter(|case| id_of(case) == id) {
            if let (Some(method), Some(Evidence::Series { points, .. })) = (case.method, &case.evidence) {
                series.push((title, method, points));
                for (rate, cost) in points {
                    table.push([&id, &method, rate, cost]);
                }
            }
        }
    }
    let all = || series.iter().flat_map(|(_, _, points)| points.iter());
    all().next()?;
    let x = Axis::log("r/M [1/s]", all().map(|p| p.0));
    let mut y = Axis::log("force evaluations", all().map(|p| p.1));
    // Room for the legend above.
    y.range[1] *= 300.0;
    let mut methods: Vec<MethodName> = Vec::new();
    for (_, method, _) in &series {
        if !methods.contains(method) {
            methods.push(*method);
        }
    }
    for title in ["a stage that resists", "a driven stage"] {
        let (mut marks, mut keys) = (Vec::new(), Vec::new());
        for (_, method, points) in series.iter().filter(|(of, ..)| *of == title) {
            // One colour a method, in both panels.
            let index = methods.iter().position(|known| known == method).unwrap_or_default();
            let (ink, shape) = (Ink::series(index), Shape::series(index));
            marks.push(Mark::Line { points: (*points).clone(), ink, dashed: false });
            marks.push(Mark::Points { points: (*points).clone(), ink, shape, hollow: false, radius: 3.0 });
            keys.push(Key::points(method.to_string(), ink, shape));
        }
        panels.push(Panel {
            title: title.to_owned(),
            description: format!("Force evaluations over r/M, {} methods.", keys.len()),
            x: x.clone(),
            y: y.clone(),
            marks,
            keys,
            key_place: KeyPlace::TopLeft,
            height: HEIGHT + 70,
        });
    }
    let is_implicit = |method: &MethodName| !matches!(method, MethodName::Taylor | MethodName::Tsit45);
    let implicit = series.iter().any(|(title, method, _)| *title == "a driven stage" && is_implicit(method));
    Some(Figure {
        name: "stiffness".into(),
        part: Part::Stability,
        message: format!(
            "A stage that resists costs a logarithm more as r/M grows, a driven one in proportion by explicit methods{}",
            if implicit { ", and no more by implicit ones" } else { "" }
        ),
        reading:
            "Force evaluations of a flight at the default tolerance over the fast rate r/M. With a drive against the \
                  viscosity the explicit cost grows in proportion; without one, rest comes inside the fast transient."
                .into(),
        claims: Vec::new(),
        panels,
        table,
    })
    // The message is what S11 and S12 claim: where one fails it is not said.
    .filter(|_| run.judged.iter().filter(|c| ["S11", "S12"].contains(&id_of(c))).all(|c| c.verdict != Verdict::Failed))
}

/// Name of the case without its method.
fn id_of(case: &JudgedCase) -> &str {
    case.id.split('/').next().unwrap_or(&case.id)
}

/// The page of `run` with its figures.
pub(super) fn to_html(run: &StressRun<'_>, figures: &[Drawn]) -> String {
    let counts = counts(run.judged);
    let verdict = counts.verdict();
    let title = "penetrode stress cases";
    let e = &run.environment;
    document(
        title,
        &format!("{title}: {}", verdict.name()),
        html! { a.skip href="#verdict" { "Skip to the verdict" } },
        html! {
            p.quiet {
                "penetrode " (e.version) ", commit " code { (e.commit) } ", " time datetime=(e.date) { (e.date) }
                ". Purpose: to show where the program holds at its edges, how far, and what it refuses."
            }
        },
        html! {
            (verdict_section(run, verdict, counts))
            nav aria-label="Contents" { ol {
                li { a href="#criteria" { "What is asked, and why" } }
                @for (_, anchor, heading, _) in KINDS { li { a href={ "#" (anchor) } { (heading) } } }
                @if run.random.is_some() { li { a href="#random" { "Random scenes" } } }
                li { a href="#reproduction" { "Reproduction" } }
            } }
            section aria-labelledby="criteria" {
                h2 id="criteria" { "What is asked, and why" }
                p { "Set before the run, in the code of each case. What is not a number never passes." }
                @for (letter, _, heading, _) in KINDS { (criteria(heading, &of_kind(run.judged, letter))) }
            }
            @for (letter, anchor, heading, meaning) in KINDS {
                section aria-labelledby=(anchor) {
                    h2 id=(anchor) { (heading) }
                    p { (meaning) }
                    @if letter == 'S' { @for drawn in figures { (figure(drawn, html! {})) } }
                    (results(heading, &of_kind(run.judged, letter)))
                }
            }
            @if let Some((summary, _)) = run.random { (random_scenes(summary)) }
            (reproduction(e))
        },
        html! { "Written by penetrode " (e.version) ". The same numbers: " a href="report.json" { "JSON" }
        ", and a CSV file for each figure." },
    )
}

fn verdict_section(run: &StressRun<'_>, verdict: Verdict, counts: Counts) -> Markup {
    let told: Vec<_> =
        run.judged.iter().filter(|case| matches!(case.verdict, Verdict::Failed | Verdict::Undecided)).collect();
    html! {
        section aria-labelledby="verdict" {
            h2 id="verdict" { "Verdict" }
            (banner(verdict, counts, "cases"))
            @if !told.is_empty() { (cases_table("Cases that failed or are undecided", &told)) }
            p.quiet { "Each case counts once for every method that it applies to. One that a method or this build cannot fly
                is skipped with the reason and does not count." }
        }
    }
}

/// Cases of one kind, each with its methods, in the order of the run.
fn of_kind(judged: &[JudgedCase], letter: char) -> Vec<&[JudgedCase]> {
    judged.chunk_by(|a, b| id_of(a) == id_of(b)).filter(|cases| cases[0].id.starts_with(letter)).collect()
}

fn limit_of(case: &JudgedCase) -> String {
    format!("{} {}", number(case.limit, 3), case.unit)
}

fn criteria(heading: &str, groups: &[&[JudgedCase]]) -> Markup {
    html! {
        details {
            summary { (heading) " (" (groups.len()) ")" }
            table.cards {
                thead { tr { th scope="col" { "case" } th scope="col" { "limit" } th scope="col" { "why this limit" } } }
                tbody { @for cases in groups {
                    @let case = &cases[0];
                    tr {
                        th scope="row" { code { (id_of(case)) } br; (case.statement) }
                        td data-label="limit" { (limit_of(case)) }
                        td data-label="why" { (case.reason) }
                    }
                } }
            }
        }
    }
}

/// One row a case; below, folded, one row a method.
fn results(heading: &str, groups: &[&[JudgedCase]]) -> Markup {
    html! {
        table.cards {
            caption { "Every case: what became of it, and the largest of what was measured" }
            thead { tr { th scope="col" { "case" } th scope="col" { "verdict" } th scope="col" { "worst measured" }
                th scope="col" { "limit" } } }
            tbody { @for cases in groups {
                @let counts = Counts::of(cases.iter().map(|case| case.verdict));
                @let worst = cases.iter().filter_map(|case| case.measured).max_by(f64::total_cmp);
                tr {
                    th scope="row" { code { (id_of(&cases[0])) } br; (cases[0].statement) }
                    td data-label="verdict" {
                        (badge(if counts.skipped == cases.len() { Verdict::Skipped } else { counts.verdict() })) br;
                        span.quiet { (tally(counts)) }
                    }
                    td.num data-label="worst measured" { (measured_of(worst)) }
                    td data-label="limit" { (limit_of(&cases[0])) }
                }
            } }
        }
        details.long {
            summary { (heading) ", method by method" }
            (cases_table("Every case for every method", &groups.iter().flat_map(|cases| cases.iter()).collect::<Vec<_>>()))
        }
    }
}

fn cases_table(caption: &str, cases: &[&JudgedCase]) -> Markup {
    html! {
        table.cards {
            caption { (caption) }
            thead { tr { th scope="col" { "case" } th scope="col" { "verdict" } th scope="col" { "measured" }
                th scope="col" { "limit" } th scope="col" { "what was seen" } } }
            tbody { @for case in cases { tr {
                th scope="row" { code { (case.id) } }
                td data-label="verdict" { (badge(case.verdict)) }
                td.num data-label="measured" { (measured_of(case.measured)) }
                td data-label="limit" { (limit_of(case)) }
                td data-label="seen" { (one_line(&case.remark)) }
            } } }
        }
    }
}

fn random_scenes(summary: &Summary) -> Markup {
    html! {
        section aria-labelledby="random" {
            h2 id="random" { "Random scenes" }
            p { (summary.scenes) " scenes over the whole admissible range, every second one aimed at an edge; "
                (summary.unresolved) " of them do not resolve, 50 digits were asked for " (summary.asked_reference)
                ". Critical velocities: " (summary.critical_found) " agree, " (summary.critical_refused)
                " are out of range and refused." }
            table.cards {
                caption { "Outcomes, over all scenes that resolve" }
                thead { tr { th scope="col" { "method" } th scope="col" { "right" } th scope="col" { "undecided" }
                    th scope="col" { "refused" } th scope="col" { "wrong" } } }
                tbody { @for (method, tally) in &summary.tallies { tr {
                    th scope="row" { (method.name()) }
                    td.num data-label="right" { (tally.right) }
                    td.num data-label="undecided" { (tally.undecided) }
                    td.num data-label="refused" { (tally.refused) }
                    td.num data-label="wrong" { (tally.wrong) }
                } } }
            }
            table.cards {
                caption { "Worst errors in ulp over max(1, condition number), limit " (ULPS_MAX)
                    ", and the scene that makes each: penetrode stress --show N" }
                thead { tr { th scope="col" { "method" } th scope="col" { "quantity" } th scope="col" { "error" }
                    th scope="col" { "scene" } } }
                tbody { @for ((method, quantity), worst) in &summary.worst { tr {
                    th scope="row" { (method.name()) }
                    td data-label="quantity" { (quantity.name()) }
                    td.num data-label="error" { (number(worst.units, 3)) }
                    td.num data-label="scene" { (worst.index) }
                } } }
            }
        }
    }
}
