//! `report.html`: one page that needs no script, no network and no other file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::applications;
use super::chart::Ink;
use super::families::{Family, group_of};
use super::figure::{Drawn, Part};
use super::figures::{fit_of, scenes_in_order, words_for};
use super::text::{count, number, one_line};
use super::{Environment, Run};
use crate::integrators::{Boundaries, VelocityAt};
use crate::physics::groups::Groups;
use crate::studies::{Path, Quantity, Stretch, formal_order};
use crate::suite::claim::StepPattern;
use crate::suite::{Check, Counts, Judged, Verdict, summary};

/// Claims told on the first screen at most.
const FIRST_SCREEN: usize = 6;

/// Limits looser than this times what is measured guard little (a claim of ours fails a test then).
const LOOSE: f64 = 100.0;

const VELOCITIES: [VelocityAt; 3] = [VelocityAt::LaggedHalfStep, VelocityAt::Centred, VelocityAt::PredictedHalfStep];
const BOUNDARIES: [Boundaries; 3] = [Boundaries::StepEnd, Boundaries::Interpolated, Boundaries::Landed];

/// The page of `run` with its figures.
pub fn to_html(run: &Run<'_>, figures: &[Drawn]) -> String {
    let families = Family::all(run.judged);
    let (verdict, counts) = summary(run.judged);
    let title = one_line(&run.suite.title);
    document(
        &title,
        &format!("{title}: {}", verdict.name()),
        html! { a.skip href="#verdict" { "Skip to the verdict" } },
        identification(run),
        html! {
            (verdict_section(run, verdict, counts))
            (contents())
            (model(run, figures))
            (algorithms(run))
            (criteria(&families))
            (code_verification(run, &families, figures))
            (solution_verification(&families))
            (cross_code(run, &families, figures))
            (events(run, &families, figures))
            (energy(run, &families, figures))
            (stability(run, &families, figures))
            (applications::paper_curve(run, &families, figures))
            (applications::applicability(run, &families, figures))
            (applications::measured_data(run, &families, figures))
            (applications::layers(run, figures))
            (applications::sensitivities(&families))
            (deviations(run, &families))
            (every_claim(run))
            (reproduction(&run.environment))
            (references())
        },
        html! { "Written by penetrode " (run.environment.version) ". The same numbers: "
        a href="report.json" { "JSON" } ", " a href="junit.xml" { "JUnit XML" } ", "
        a href="summary.md" { "Markdown" } ", and a CSV file for each figure." },
    )
}

/// A page of the program: its head, and these parts.
#[expect(clippy::needless_pass_by_value, reason = "every caller makes them in place")]
pub(super) fn document(
    heading: &str,
    window_title: &str,
    skip: Markup,
    identification: Markup,
    main: Markup,
    footer: Markup,
) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                // The page asks for nothing; should it ever try, the browser refuses.
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; style-src 'unsafe-inline'; img-src data:";
                meta name="color-scheme" content="light dark";
                link rel="icon" href="data:,";
                title { (window_title) }
                style { (PreEscaped(Ink::style_sheet())) (PreEscaped(include_str!("page.css"))) }
            }
            body {
                (skip)
                header { h1 { (heading) } (identification) }
                main { (main) }
                footer { (footer) }
            }
        }
    };
    page.into_string()
}

const SECTIONS: [(&str, &str); 19] = [
    ("verdict", "Verdict"),
    ("model", "Model, assumptions, validity"),
    ("algorithms", "Algorithms and their formal orders"),
    ("criteria", "Acceptance criteria"),
    ("code", "Code verification"),
    ("solution", "Solution verification"),
    ("cross-code", "Comparison with other programs"),
    ("events", "Event verification"),
    ("energy", "Energy and other invariants"),
    ("stability", "Stability and rounding"),
    ("slab", "The paper's curve: critical energy over the thickness"),
    ("applicability", "How far Eq. 11-12 holds"),
    ("measured", "Measured depths"),
    ("layers", "Layered targets"),
    ("sensitivities", "Sensitivities"),
    ("deviations", "Deviations and limits of what was shown"),
    ("claims", "Every claim"),
    ("reproduction", "Reproduction"),
    ("references", "References"),
];

fn contents() -> Markup {
    html! {
        nav aria-label="Contents" {
            ol { @for (id, title) in SECTIONS { li { a href={ "#" (id) } { (title) } } } }
        }
    }
}

#[expect(clippy::needless_pass_by_value, reason = "every caller makes it in place")]
pub(super) fn section(id: &str, body: Markup) -> Markup {
    let title = SECTIONS.iter().find(|(known, _)| *known == id).map_or(id, |(_, title)| title);
    html! { section aria-labelledby=(id) { h2 id=(id) { (title) } (body) } }
}

fn identification(run: &Run<'_>) -> Markup {
    let environment = &run.environment;
    html! {
        p.quiet {
            "penetrode " (environment.version) ", commit " code { (environment.commit) } ", "
            time datetime=(environment.date) { (environment.date) } ". "
            "Purpose: to show what the program computes right, how far, and where it was not tried."
        }
    }
}

fn sign(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "✓",
        Verdict::Failed => "✗",
        Verdict::Undecided => "?",
        Verdict::Skipped => "–",
    }
}

pub(super) fn badge(verdict: Verdict) -> Markup {
    html! { span.badge.(verdict.name()) { (sign(verdict)) " " (verdict.name()) } }
}

/// The verdict in large letters with what it means, and how many came to what.
pub(super) fn banner(verdict: Verdict, counts: Counts, noun: &str) -> Markup {
    let decided = counts.passed + counts.failed + counts.undecided;
    let meaning = match verdict {
        Verdict::Passed => format!("All {decided} {noun} that apply hold within their limits."),
        Verdict::Failed => format!("{} of {decided} {noun} that apply do not hold.", counts.failed),
        Verdict::Undecided if decided == 0 => "Nothing was decided, so nothing was shown.".to_owned(),
        Verdict::Undecided => format!("{} of {decided} {noun} that apply could not be decided.", counts.undecided),
        Verdict::Skipped => String::new(),
    };
    html! {
        div.verdict.(verdict.name()) {
            span.word { (sign(verdict)) " " (verdict.name()) }
            span.sum { (meaning) }
        }
        ul.counts {
            @for (verdict, number) in [
                (Verdict::Passed, counts.passed),
                (Verdict::Failed, counts.failed),
                (Verdict::Undecided, counts.undecided),
                (Verdict::Skipped, counts.skipped),
            ] { li.(verdict.name()) { b { (number) } (verdict.name()) } }
        }
    }
}

fn verdict_section(run: &Run<'_>, verdict: Verdict, counts: Counts) -> Markup {
    let mut told: Vec<_> =
        run.judged.iter().filter(|j| matches!(j.verdict, Verdict::Failed | Verdict::Undecided)).collect();
    told.sort_by_key(|j| std::cmp::Reverse(j.verdict));
    section(
        "verdict",
        html! {
            (banner(verdict, counts, "claims"))
            @if !told.is_empty() {
                (claims_table("Claims that failed or are undecided", &told[..told.len().min(FIRST_SCREEN)]))
                @if told.len() > FIRST_SCREEN {
                    p { (told.len() - FIRST_SCREEN) " more are under " a href="#claims" { "every claim" } "." }
                }
            }
            p.quiet { "A claim that does not apply to its scene is skipped with the reason and does not count. A claim is
                undecided where the measurement cannot tell: noise, the round-off floor, or inside an error bar." }
        },
    )
}

pub(super) fn measured_of(value: Option<f64>) -> String {
    value.map_or_else(|| "—".to_owned(), |m| number(m, 3))
}

/// One row a claim; on a narrow screen one card.
fn claims_table(caption: &str, judged: &[&Judged]) -> Markup {
    html! {
        table.cards {
            caption { (caption) }
            thead { tr { th scope="col" { "claim" } th scope="col" { "verdict" } th scope="col" { "measured" }
                th scope="col" { "limit" } th scope="col" { "what was seen" } } }
            tbody { @for judged in judged { tr {
                th scope="row" { code { (one_line(&judged.claim.id)) } br; (one_line(&judged.claim.statement)) }
                td data-label="verdict" { (badge(judged.verdict)) }
                td.num data-label="measured" { (measured_of(judged.measured)) }
                td data-label="limit" { (number(judged.claim.limit, 3)) " " (judged.claim.check.unit()) }
                td data-label="seen" { (one_line(&judged.remark)) }
            } } }
        }
    }
}

/// One row a family of claims.
fn families_table(caption: &str, families: &[&Family<'_>]) -> Markup {
    html! {
        table.cards {
            caption { (caption) }
            thead { tr { th scope="col" { "claims" } th scope="col" { "verdict" } th scope="col" { "worst measured" }
                th scope="col" { "limit" } } }
            tbody { @for family in families {
                @let counts = family.counts();
                tr {
                    th scope="row" { code { (one_line(family.id)) } br; (one_line(&family.first().claim.statement)) }
                    td data-label="verdict" {
                        (badge(family.verdict())) br; span.quiet { (tally(counts)) }
                    }
                    td.num data-label="worst measured" { (measured_of(family.worst())) }
                    td data-label="limit" { (number(family.first().claim.limit, 3)) " " (family.first().claim.check.unit()) }
                }
            } }
        }
    }
}

/// `12 passed, 3 skipped`.
pub(super) fn tally(counts: Counts) -> String {
    [
        (counts.failed, Verdict::Failed),
        (counts.undecided, Verdict::Undecided),
        (counts.passed, Verdict::Passed),
        (counts.skipped, Verdict::Skipped),
    ]
    .iter()
    .filter(|(number, _)| *number > 0)
    .map(|(number, verdict)| format!("{number} {}", verdict.name()))
    .collect::<Vec<_>>()
    .join(", ")
}

pub(super) fn figures_of(run: &Run<'_>, figures: &[Drawn], part: Part) -> Markup {
    html! {
        @for drawn in figures.iter().filter(|f| f.figure.part == part) {
            (figure(drawn, html! {
                @if let Some(first) = drawn.figure.claims.first() {
                    "Judged by " (claims_in_words(&drawn.figure.claims))
                    "; remade by "
                    code { "penetrode verify --only " (one_line(first)) " --seed " (run.environment.seed) } ". "
                }
            }))
        }
    }
}

/// A figure with its message, how to read it, where it comes from, and its files.
#[expect(clippy::needless_pass_by_value, reason = "every caller makes it in place")]
pub(super) fn figure(drawn: &Drawn, origin: Markup) -> Markup {
    let figure = &drawn.figure;
    html! {
        figure id={ "figure-" (figure.name) } {
            figcaption {
                b { (one_line(&figure.message)) }
                (figure.reading)
                span.quiet {
                    (origin)
                    a href={ "tables/" (figure.name) ".csv" } { (count(figure.table.len(), "row")) " as CSV" } ", "
                    a href={ "figures/" (figure.name) ".svg" } { "figure as SVG" } "."
                }
            }
            div.panels { @for index in 0..drawn.panels.len() { (PreEscaped(drawn.inline(index))) } }
        }
    }
}

fn claims_in_words(claims: &[String]) -> Markup {
    const NAMED: usize = 3;
    html! {
        @for (index, id) in claims.iter().take(NAMED).enumerate() {
            @if index > 0 { ", " }
            code { (one_line(id)) }
        }
        @if claims.len() > NAMED { " and " (claims.len() - NAMED) " more" }
    }
}

fn model(run: &Run<'_>, figures: &[Drawn]) -> Markup {
    section(
        "model",
        html! {
            p { "A rigid projectile of mass " var { "M" } " moves along a line into concrete:" }
            div.equation {
                var { "M" } " d" var { "V" } "/d" var { "t" } " = −" var { "F" } "(" var { "x" } ", " var { "V" } "), d"
                var { "x" } "/d" var { "t" } " = " var { "V" } ", " var { "x" } "(0) = 0, " var { "V" } "(0) = " var { "V" } "₀" br;
                "crater, 0 ≤ " var { "x" } " < " var { "k d" } ": " var { "F" } " = " var { "c x" } " (Eq. 4)" br;
                "tunnel, " var { "x" } " ≥ " var { "k d" } ": " var { "F" } " = " var { "P" } " + " var { "Q V" } "² (Eq. 5), "
                var { "P" } " = " var { "S f" } sub { "c" } " π" var { "d" } "²/4, " var { "Q" } " = " var { "N* B ρ" } " π" var { "d" } "²/4" br;
                "any stage: " var { "F" } " = " var { "p" } " + " var { "s x" } " + " var { "r V" } " + " var { "q V" } "², up to its end in " var { "x" }
            }
            p { "Motion ends at rest, or where the exit depth is reached, with or without velocity left. The crater constant "
                var { "c" } " makes the force continuous at " var { "x" } " = " var { "k d" } " unless a scene gives one; the force then jumps there." }
            h3 { "Assumptions" }
            ul {
                li { "The projectile is rigid and keeps its mass, nose and direction; the path is straight and normal to the target." }
                li { "The target resists by its stages alone: no free surface but the crater, no scabbing, no reinforcement." }
                li { "The criterion for perforation is " var { "x" } " = " var { "H" } " unless a scene asks for the ACE/NDRC relation." }
            }
            h3 { "Validity" }
            ul {
                li { "Eq. 14, " var { "S" } " = 72 (" var { "f" } sub { "c" } "/MPa)" sup { "−1/2" } ", was fitted to strengths from 13.5 to 96.7 MPa." }
                li { "Eq. 11-12 is the limit " var { "N" } " → ∞ of this equation of motion. At finite " var { "N" }
                    " the depth differs from it by −(" var { "I" } "² − (" var { "k" } "π/4)²)/(π" var { "N" } ") calibers in the tunnel and by the factor 1 + ("
                    var { "k" } "π/4 − " var { "I" } ")/(2" var { "N" } ") in the crater, to first order. That is a property of the model and no error of a method." }
                li { "Eq. 15 is Eq. 11-12 (" var { "k" } " = 2) inside the ACE/NDRC relation, for " var { "H/d" } " up to 18." }
            }
            (figures_of(run, figures, Part::Model))
            (scenes(run))
        },
    )
}

fn scenes(run: &Run<'_>) -> Markup {
    let resolved: Vec<_> = scenes_in_order(run)
        .into_iter()
        .filter_map(|name| {
            let scene = run.suite.scenes.get(&name)?;
            let problem = scene.problem().ok()?;
            let groups = Groups::of(scene, problem.impact_speed);
            Some((name, problem, groups))
        })
        .collect();
    html! {
        @if !resolved.is_empty() {
            details {
                summary { "Parameters of " (count(resolved.len(), "scene")) ", in SI units" }
                div.scroll tabindex="0" role="region" aria-label="Parameters of the scenes" {
                    table.grid {
                        thead { tr { th scope="col" { "scene" } th scope="col" { "M [kg]" } th scope="col" { "V₀ [m/s]" }
                            th scope="col" { "exit depth [m]" } th scope="col" { "I" } th scope="col" { "N" }
                            th scope="col" { "stages: p [N], s [N/m], r [kg/s], q [kg/m], until x [m]" } } }
                        tbody { @for (name, problem, groups) in &resolved { tr {
                            th scope="row" { code { (one_line(name)) } }
                            td.num { (number(problem.mass, 6)) }
                            td.num { (number(problem.impact_speed, 6)) }
                            td.num { (number(problem.exit_depth, 6)) }
                            td.num { @if let Some(groups) = groups { (number(groups.impact, 5)) } @else { "—" } }
                            td.num { @match groups {
                                Some(Groups { geometry: Some(n), .. }) => (number(*n, 5)),
                                Some(_) => "∞",
                                None => "—",
                            } }
                            td.num { @for (index, stage) in problem.stages.iter().enumerate() {
                                @if index > 0 { br; }
                                (number(stage.static_force, 6)) ", " (number(stage.stiffness, 6)) ", "
                                (number(stage.viscosity, 6)) ", " (number(stage.drag, 6)) ", " (number(stage.end, 6))
                            } }
                        } } }
                    }
                }
            }
        }
    }
}

/// The kinds of way that decide an order, in the order of the table.
const WAYS: [(&str, bool, Stretch); 4] = [
    ("rest in the crater", false, Stretch { velocity_dependent: false, force_jumps: false }),
    ("tunnel without drag", true, Stretch { velocity_dependent: false, force_jumps: false }),
    ("tunnel with drag", true, Stretch { velocity_dependent: true, force_jumps: false }),
    ("tunnel with drag, force jumps at k d", true, Stretch { velocity_dependent: true, force_jumps: true }),
];

type Orders = [Option<f64>; 6];

/// Formal orders of one variant on one kind of way, for a stop and for an exit together.
fn orders_of(velocity: VelocityAt, boundaries: Boundaries, leaves_crater: bool, to_end: Stretch) -> Orders {
    let to_crater_end = leaves_crater.then(Stretch::default);
    Quantity::ALL.map(|quantity| {
        let perforates = matches!(quantity, Quantity::Velocity | Quantity::CriticalVelocity);
        if perforates && !leaves_crater {
            return None;
        }
        formal_order(velocity, boundaries, &Path { perforates, to_crater_end, to_end }, quantity)
    })
}

/// Variants of the same orders in one row: `(way, velocity rules, boundary rules, orders)`.
fn formal_rows() -> Vec<(&'static str, String, String, Orders)> {
    let mut rows = Vec::new();
    for (way, leaves_crater, to_end) in WAYS {
        for boundaries in BOUNDARIES {
            let mut groups: Vec<(Vec<VelocityAt>, Orders)> = Vec::new();
            for velocity in VELOCITIES {
                let orders = orders_of(velocity, boundaries, leaves_crater, to_end);
                match groups.iter_mut().find(|(_, known)| *known == orders) {
                    Some((velocities, _)) => velocities.push(velocity),
                    None => groups.push((vec![velocity], orders)),
                }
            }
            for (velocities, orders) in groups {
                let names = if velocities.len() == VELOCITIES.len() {
                    "any".to_owned()
                } else {
                    velocities.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ")
                };
                rows.push((way, names, boundaries.to_string(), orders));
            }
        }
    }
    rows
}

fn algorithms(run: &Run<'_>) -> Markup {
    let quantities = Quantity::ALL.map(words_for);
    let missing: Vec<_> = crate::integrators::MethodName::ALL.into_iter().filter(|m| !m.is_built()).collect();
    section(
        "algorithms",
        html! {
            p { "The order of the paper's scheme has no single value. It belongs to the velocity in the drag, to the rule at
                boundaries, to the way, and to the quantity. The table is computed by the function that the claims are judged by." }
            div.scroll tabindex="0" role="region" aria-label="Formal orders of the central difference" {
                table.grid {
                    caption { "Formal orders of the central difference (Eq. 6-8) in the step" }
                    thead { tr { th scope="col" { "way" } th scope="col" { "velocity" } th scope="col" { "boundaries" }
                        @for quantity in quantities { th scope="col" { (quantity) } } } }
                    tbody { @for (way, velocities, boundaries, orders) in formal_rows() { tr {
                        th scope="row" { (way) } td { (velocities) } td { (boundaries) }
                        @for order in orders { td.num { @match order { Some(order) => (order), None => "—" } } }
                    } } }
                }
            }
            p.quiet { b { "lagged" } ": V half a step before, as an explicit finite-element code hands it to a subroutine (the paper). "
                b { "centred" } ": V at the step, from a quadratic. " b { "predicted" } ": half a step ahead with the lagged force. "
                b { "step-end" } ": seen at the first step past a boundary (the paper). " b { "interpolated" } ": located inside the step. "
                b { "landed" } ": the step is shortened to end on the boundary." }
            h3 { "Other methods" }
            dl.facts {
                dt { "taylor" } dd { "Taylor series in t, stage by stage, events as roots of the polynomial; accurate to round-off, order chosen." }
                dt { "energy" } dd { "V² over x, stage by stage: no event to find but rest; accurate to round-off." }
                dt { "tsit45" } dd { "Tsitouras 5(4), order 5, step from the tolerance." }
                dt { "bdf" } dd { "Backward differences, variable order, for stiff stages." }
                dt { "esdirk34, tr-bdf2" } dd { "Implicit Runge-Kutta, orders 3 and 2, for stiff stages." }
                dt { "adaptive" } dd { "Chooses tsit45 or bdf stage by stage." }
                dt { "closed-form" } dd { "Nothing is integrated; what the others are measured by." }
            }
            @if !missing.is_empty() {
                p { "This build leaves out " (missing.iter().map(|m| m.name()).collect::<Vec<_>>().join(", "))
                    "; their claims are skipped." }
            }
            p.quiet { "Built for " (run.environment.target) " by " (run.environment.rustc) "." }
        },
    )
}

fn criteria(families: &[Family<'_>]) -> Markup {
    section(
        "criteria",
        html! {
            p { "Set before the run, in the suite. A claim passes when what is measured is at most its limit; what is not a
                number never passes." }
            @for group in families.chunk_by(|a, b| group_of(a.id) == group_of(b.id)) {
                details {
                    summary { (one_line(group_of(group[0].id))) " (" (count(group.len(), "criterion").replace("criterions", "criteria")) ")" }
                    table.cards {
                        thead { tr { th scope="col" { "claim" } th scope="col" { "limit" } th scope="col" { "why this limit" } } }
                        tbody { @for family in group {
                            @let claim = &family.first().claim;
                            tr {
                                th scope="row" { code { (one_line(family.id)) } br; (one_line(&claim.statement)) }
                                td data-label="limit" { (number(claim.limit, 3)) " " (claim.check.unit()) }
                                td data-label="why" { (one_line(&claim.reason)) }
                            }
                        } }
                    }
                }
            }
        },
    )
}

/// What a check is evidence of: the part of the report that shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Exact,
    Order,
    Discrete,
    Solution,
    CrossCode,
    Event,
    Invariant,
    Stability,
    Slab,
    Applicability,
    Measured,
    Sensitivity,
}

/// Every check has its place: one that is new does not compile without.
fn kind_of(check: &Check) -> Kind {
    match check {
        Check::Reference { .. }
        | Check::Agreement { .. }
        | Check::Stated { .. }
        | Check::Nose {}
        | Check::SmallImpact { .. }
        | Check::ApproachOrder { .. }
        | Check::ApproachConstant { .. }
        | Check::Eq15 { .. }
        | Check::Eq15Jump { .. }
        | Check::NdrcCriterion { .. } => Kind::Exact,
        Check::Order { .. } | Check::Manufactured { .. } | Check::Proportionality { .. } | Check::WorkOrder { .. } => {
            Kind::Order
        }
        Check::DiscreteSolution { .. }
        | Check::CraterConstant {}
        | Check::CraterBand {}
        | Check::LaggedConstant {}
        | Check::Clock { .. } => Kind::Discrete,
        Check::SelfConvergence {} | Check::GridConvergence {} => Kind::Solution,
        Check::Pair { .. } | Check::Peer { .. } => Kind::CrossCode,
        Check::Outcome { .. } | Check::EventOrder {} | Check::Margin { .. } => Kind::Event,
        Check::EnergyBalance {} | Check::TimeReversal {} | Check::Similarity { .. } | Check::Split { .. } => {
            Kind::Invariant
        }
        Check::StabilityLimit {} | Check::StabilityMap { .. } | Check::RoundingFloor { .. } => Kind::Stability,
        Check::Sweep { .. } => Kind::Slab,
        Check::Map { .. } => Kind::Applicability,
        Check::MeasuredDepth {} => Kind::Measured,
        Check::Sensitivities {} => Kind::Sensitivity,
    }
}

fn of_kind<'f, 'a>(families: &'f [Family<'a>], kind: Kind) -> Vec<&'f Family<'a>> {
    families.iter().filter(|f| kind_of(&f.first().claim.check) == kind).collect()
}

/// Families of a section, or a sentence where the suite has none.
pub(super) fn results(caption: &str, families: &[Family<'_>], kind: Kind) -> Markup {
    let families = of_kind(families, kind);
    html! {
        @if families.is_empty() { p { "This suite claims nothing of this kind." } }
        @else { (families_table(caption, &families)) }
    }
}

fn code_verification(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    section(
        "code",
        html! {
            p { "Is the equation solved right? Measured against answers known by other means: closed forms, their 50-digit
                evaluation, manufactured paths, and the exact solutions of the scheme's own difference equation." }
            h3 { "Exact answers and formulas" }
            (results("Errors beside the exact answer", families, Kind::Exact))
            h3 { "Orders of convergence" }
            p { "Each order is a least-squares fit over random step sizes with its 95 % interval. Orders from pairs of steps
                are noise here, and are not shown." }
            (figures_of(run, figures, Part::CodeVerification))
            (order_tables(run))
            (results("Orders beside the formal ones", families, Kind::Order))
            h3 { "Exact discrete solutions and error constants" }
            p { "Stronger than an order: the scheme must give its own discrete solution to round-off, and its leading error
                must have the predicted constant. A right order with a wrong constant is wrong." }
            (results("Discrete solutions and constants", families, Kind::Discrete))
        },
    )
}

/// Scene by scene: variants of the scheme against quantities.
fn order_tables(run: &Run<'_>) -> Markup {
    let orders: Vec<&Judged> = run
        .judged
        .iter()
        .filter(|j| matches!(j.claim.check, Check::Order { steps: StepPattern::Uniform, .. }) && fit_of(j).is_some())
        .collect();
    let scenes: Vec<String> = scenes_in_order(run)
        .into_iter()
        .filter(|scene| orders.iter().any(|j| j.claim.scene.as_deref() == Some(scene)))
        .collect();
    html! {
        @for (index, scene) in scenes.iter().enumerate() {
            @let mine: Vec<_> = orders.iter().filter(|j| j.claim.scene.as_deref() == Some(scene)).collect();
            @let quantities: Vec<_> = Quantity::ALL.into_iter()
                .filter(|q| mine.iter().any(|j| j.claim.quantity == Some(*q))).collect();
            details open[index == 0] {
                summary { "Observed orders, scene " code { (one_line(scene)) } }
                div.scroll tabindex="0" role="region" aria-label={ "Observed orders, scene " (one_line(scene)) } {
                    table.grid {
                        caption { "observed order, half-width of its 95 % interval, and the formal order in brackets" }
                        thead { tr { th scope="col" { "velocity" } th scope="col" { "boundaries" }
                            @for quantity in &quantities { th scope="col" { (words_for(*quantity)) } } } }
                        tbody { @for (velocity, boundaries) in variants(&mine) { tr {
                            th scope="row" { (velocity) } td { (boundaries) }
                            @for quantity in &quantities {
                                td.num { @if let Some(judged) = mine.iter().find(|j| j.claim.velocity == velocity
                                    && j.claim.boundaries == boundaries && j.claim.quantity == Some(*quantity)) {
                                    (order_cell(judged))
                                } @else { "—" } }
                            }
                        } } }
                    }
                }
            }
        }
    }
}

/// The variants of the scheme that `judged` claim something of, in the order of the tables.
fn variants(judged: &[&&Judged]) -> Vec<(VelocityAt, Boundaries)> {
    let all = VELOCITIES.into_iter().flat_map(|velocity| BOUNDARIES.map(|boundaries| (velocity, boundaries)));
    all.filter(|variant| judged.iter().any(|j| (j.claim.velocity, j.claim.boundaries) == *variant)).collect()
}

fn order_cell(judged: &Judged) -> Markup {
    html! {
        @if let Some((_, formal, fit)) = fit_of(judged) {
            @if let Some(line) = fit.line {
                (format!("{:.2} ± {:.2} ({formal})", line.order, 0.5 * (line.interval95[1] - line.interval95[0])))
            } @else { "no fit (" (formal) ")" }
            " " span.(judged.verdict.name()) aria-label=(judged.verdict.name()) role="img" { (sign(judged.verdict)) }
        }
    }
}

fn solution_verification(families: &[Family<'_>]) -> Markup {
    section(
        "solution",
        html! {
            p { "How far is a computed answer from its limit where nothing exact is known? The values alone are fitted
                (Eça-Hoekstra least squares, Richardson, grid convergence index); here the exact answer then tells whether the
                stated uncertainty holds it. Measured: error over stated uncertainty." }
            (results("Self-convergence", families, Kind::Solution))
            @let told: Vec<&Judged> = of_kind(families, Kind::Solution).iter().flat_map(|f| f.members).collect();
            @if !told.is_empty() {
                details { summary { "Limit, band and rule of each" } (claims_table("Self-convergence, claim by claim", &told)) }
            }
        },
    )
}

fn cross_code(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    section(
        "cross-code",
        html! {
            p { "Differences are the largest of any quantity, divided by its conditioning, in units of the combined tolerance." }
            @if !run.environment.peers.is_empty() {
                dl.facts { @for (name, text) in &run.environment.peers { dt { (one_line(name)) } dd { (one_line(text)) } } }
            }
            (figures_of(run, figures, Part::CrossCode))
            (results("Methods and programs beside each other", families, Kind::CrossCode))
        },
    )
}

fn events(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    section(
        "events",
        html! {
            p { "Each event must stand once, at its place, in order; an outcome may be undecided inside its error bar, but never
                wrong. A time is as good as its event is located." }
            (figures_of(run, figures, Part::Events))
            (results("Events and outcomes", families, Kind::Event))
        },
    )
}

fn energy(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    section(
        "energy",
        html! {
            p { "What must hold whatever the answer is: energy, reversal in time, scaling, and cutting the way in pieces." }
            (figures_of(run, figures, Part::Energy))
            (results("Invariants", families, Kind::Invariant))
        },
    )
}

fn stability(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    section(
        "stability",
        html! {
            p { "In the crater the scheme is stable for w dt < 2, w² = c/M; the limit is found by measurement. The lagged drag
                is monotone for 2 Q V dt/M < 1 and stable for < 2. Below every step size there is the rounding of the numbers." }
            (figures_of(run, figures, Part::Stability))
            (results("Stability limits and rounding", families, Kind::Stability))
            p.quiet { "Events at their edges, extreme scenes and stiffness: " code { "penetrode stress --out DIR" }
                " writes a report of their own." }
        },
    )
}

fn deviations(run: &Run<'_>, families: &[Family<'_>]) -> Markup {
    let failed: Vec<&Judged> =
        run.judged.iter().filter(|j| matches!(j.verdict, Verdict::Failed | Verdict::Undecided)).collect();
    let mut reasons: Vec<(String, usize)> = Vec::new();
    for judged in run.judged.iter().filter(|j| j.verdict == Verdict::Skipped) {
        let reason = one_line(&judged.remark);
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, number)) => *number += 1,
            None => reasons.push((reason, 1)),
        }
    }
    let loose: Vec<_> = families
        .iter()
        .filter_map(|f| {
            let tightest = f.members.iter().filter_map(Judged::looseness).min_by(f64::total_cmp)?;
            (tightest > LOOSE).then_some((f.id, tightest))
        })
        .collect();
    section(
        "deviations",
        html! {
            @if failed.is_empty() { p { "No claim failed and none is undecided." } }
            @else { (claims_table("Claims that failed or are undecided", &failed)) }
            @if !reasons.is_empty() {
                h3 { "Skipped, and why" }
                ul { @for (reason, number) in &reasons { li { (reason) " (" (count(*number, "claim")) ")" } } }
            }
            @if !loose.is_empty() {
                h3 { "Limits that guard little" }
                p { "More than " (LOOSE) " times what was measured in every scene:" }
                ul { @for (id, times) in &loose { li { code { (one_line(id)) } ", " (number(*times, 2)) " times" } } }
            }
            h3 { "What was not shown" }
            ul {
                li { "This is verification: that the equation is solved right. Whether it is the right equation for a given
                    target is validation, and needs experiments." }
                li { "Claims hold for the scenes named and for random scenes of the seed, not for every scene." }
                li { "Orders are those between the steps tried, 10⁻⁵ to 10⁻² of the time of flight; outside, nothing was measured." }
                li { "A 95 % interval misses the truth once in twenty times. Verdicts therefore rest on wider bands." }
                li { "Recorded answers of other programs were made once; " code { "--live-peers" } " asks the programs again." }
                li { "Programs are not compared in speed here: " code { "penetrode bench" } " does, in a report of its own." }
            }
        },
    )
}

fn every_claim(run: &Run<'_>) -> Markup {
    section(
        "claims",
        html! {
            p.onpaper { "On paper only the counts; the claims one by one are in report.html and report.json." }
            @for group in run.judged.chunk_by(|a, b| group_of(&a.claim.id) == group_of(&b.claim.id)) {
                @let counts = Counts::of(group.iter().map(|j| j.verdict));
                @let name = one_line(group_of(&group[0].claim.id));
                details.long {
                    summary { (name) ": " (tally(counts)) }
                    (claims_table(&format!("Claims of {name}"), &group.iter().collect::<Vec<_>>()))
                }
            }
        },
    )
}

/// What remakes a run.
pub(super) fn reproduction(e: &Environment) -> Markup {
    section(
        "reproduction",
        html! {
            pre { code { (one_line(&e.command)) } }
            dl.facts {
                (program(e))
                dt { "Processor" } dd { (one_line(&e.cpu)) ", " (count(e.threads, "thread")) }
                dt { "Floating point" } dd { (e.floating_point) }
                dt { "Lock file (BLAKE3)" } dd { code { (e.lock_file_hash) } }
                @if let Some(hash) = &e.suite_hash { dt { "Suite (BLAKE3)" } dd { code { (hash) } } }
                dt { "Scenes (BLAKE3)" } dd { code { (e.scenes_hash) } }
                dt { "Date" } dd { time datetime=(e.date) { (e.date) } }
            }
            p.quiet { "The same command, program and seed give the same numbers on the same kind of processor; only the date,
                the number of threads and the times in the JSON and JUnit files differ." }
        },
    )
}

/// The program and its seed, as rows of a list of facts.
pub(super) fn program(e: &Environment) -> Markup {
    html! {
        dt { "Program" } dd { "penetrode " (e.version) ", commit " code { (e.commit) } }
        dt { "Built by" } dd { (e.rustc) ", profile " (e.profile) ", for " (e.target) }
        dt { "Features" } dd { @if e.features.is_empty() { "none" } @else { (e.features.join(", ")) } }
        dt { "Seed" } dd { (e.seed) }
    }
}

fn references() -> Markup {
    section(
        "references",
        html! {
            ul {
                li { "X. W. Chen, Q. M. Li (2002). Deep penetration of a non-deformable projectile with different geometrical
                    characteristics. Int. J. Impact Eng. 27, 619-637." }
                li { "Q. M. Li, X. W. Chen (2003). Dimensionless formulae for penetration depth of concrete target impacted by a
                    non-deformable projectile. Int. J. Impact Eng. 28, 93-116." }
                li { "M. J. Forrestal, B. S. Altman, J. D. Cargile, S. J. Hanchak (1994). An empirical equation for penetration
                    depth of ogive-nose projectiles into concrete targets. Int. J. Impact Eng. 15, 395-405." }
                li { "R. P. Kennedy (1976). A review of procedures for the analysis and design of concrete structures to resist
                    missile impact effects. Nucl. Eng. Des. 37, 183-203." }
                li { "P. J. Roache (1998). Verification and Validation in Computational Science and Engineering. Hermosa." }
                li { "I. B. Celik et al. (2008). Procedure for estimation and reporting of uncertainty due to discretization in
                    CFD applications. J. Fluids Eng. 130, 078001." }
                li { "L. Eça, M. Hoekstra (2014). A procedure for the estimation of the numerical uncertainty of CFD calculations
                    based on grid refinement studies. J. Comput. Phys. 262, 104-130." }
                li { "W. L. Oberkampf, C. J. Roy (2010). Verification and Validation in Scientific Computing. Cambridge." }
            }
        },
    )
}
