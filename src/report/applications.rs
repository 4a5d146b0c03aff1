//! The sections of the report on what the verified solver is used for: the paper's curve, the range of Eq. 11-12,
//! measured depths, layers, sensitivities.

use maud::{Markup, html};

use super::Run;
use super::families::Family;
use super::figure::{Drawn, Part};
use super::page::{Kind, badge, figures_of, results, section, tally};
use super::text::{count, number, one_line};
use crate::studies::experiments::{self, Comparison};
use crate::studies::sweep::{WHY, explanation};
use crate::suite::{Counts, Evidence, Verdict};

/// The first evidence of a kind.
fn evidence<'a, T>(run: &Run<'a>, pick: impl Fn(&'a Evidence) -> Option<T>) -> Option<T> {
    run.judged.iter().find_map(|judged| judged.evidence.as_ref().and_then(&pick))
}

pub(super) fn paper_curve(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    let told = evidence(run, |evidence| match evidence {
        Evidence::Sweep { plan, rows } => Some(explanation(plan, rows)),
        _ => None,
    });
    section(
        "slab",
        html! {
            p { "The paper's result: critical impact energy over H/d, by simulation and by the semi-empirical Eq. 15." }
            (figures_of(run, figures, Part::Slab))
            @if let Some(told) = told.as_deref() {
                h3 { (WHY) }
                p { (told.strip_prefix(WHY).unwrap_or(told).trim_start_matches(". ").replace('`', "")) }
            }
            (results("Points of the curve", families, Kind::Slab))
            p.quiet { "Along another slab: " code { "penetrode sweep SCENE.toml --vary H/d=0.5:18:200 --out fig4.csv" }
                "; with measured points: " code { "--data POINTS.csv" } ", there and in " code { "verify" } "." }
        },
    )
}

pub(super) fn applicability(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    section(
        "applicability",
        html! {
            p { "Eq. 11-12 is the limit N → ∞. Its error at finite N, exact and not to first order, says where a hand
                calculation will do: it needs N well above I, and above 1." }
            (figures_of(run, figures, Part::Applicability))
            (results("The map against flights", families, Kind::Applicability))
        },
    )
}

pub(super) fn measured_data(run: &Run<'_>, families: &[Family<'_>], figures: &[Drawn]) -> Markup {
    let comparisons = evidence(run, |evidence| match evidence {
        Evidence::Depths(comparisons) => Some(comparisons.as_slice()),
        _ => None,
    });
    section(
        "measured",
        html! {
            p { "This is the one part of the report that is not verification: the equation beside experiments of others. The
                prediction takes S of Eq. 14, k = 0.707 + h/d and N* from the nose; nothing is fitted here." }
            (figures_of(run, figures, Part::Measured))
            @if let Some(comparisons) = comparisons { (sets_table(comparisons)) }
            (results("Medians of the sets", families, Kind::Measured))
            h3 { "What these data validate, and what not" }
            p { (experiments::MEANING) }
        },
    )
}

/// Median and spread of each set, and the terms of ASME V&V 20.
fn sets_table(comparisons: &[Comparison]) -> Markup {
    let percent = |share: f64| format!("{} %", number(100.0 * share, 2));
    let numerical = comparisons.iter().map(|c| c.numerical_uncertainty / c.predicted).fold(0.0, f64::max);
    let given = |get: fn(&Comparison) -> Option<f64>| match comparisons.iter().filter_map(get).count() {
        0 => "not given".to_owned(),
        n => format!("given for {n} of {}", count(comparisons.len(), "shot")),
    };
    html! {
        table.cards {
            caption { "Predicted over measured depth, set by set; E = S − D is the comparison error after ASME V&V 20" }
            thead { tr { th scope="col" { "set" } th scope="col" { "shots" } th scope="col" { "median" }
                th scope="col" { "spread" } th scope="col" { "range" } th scope="col" { "within ±20 %" }
                th scope="col" { "in range of S" } th scope="col" { "mean E/D" } th scope="col" { "u_val/D" } } }
            tbody { @for set in experiments::summaries(comparisons) { tr {
                th scope="row" { (one_line(&set.group)) }
                td.num data-label="shots" { (set.shots) }
                td.num data-label="median" { (format!("{:.2}", set.median)) }
                td.num data-label="spread" { (format!("{:.2}", set.spread)) }
                td.num data-label="range" { (format!("{:.2} to {:.2}", set.extremes.0, set.extremes.1)) }
                td.num data-label="within ±20 %" { (set.within_band) }
                td.num data-label="in range of S" { (set.in_range_of_fit) }
                td.num data-label="mean E/D" { (percent(set.mean_error)) }
                td data-label="u_val/D" { (set.validation_uncertainty.map_or("not given".to_owned(), percent)) }
            } } }
        }
        dl.facts {
            dt { "u_num, numerical" } dd { (number(numerical, 2)) " of the depth at most" }
            dt { "u_input, inputs" } dd { (given(|c| c.input_uncertainty)) }
            dt { "u_D, data" } dd { (given(|c| c.shot.depth_uncertainty)) " by the sources" }
        }
        p { "The validation uncertainty u_val² = u_num² + u_input² + u_D² can only be stated where all three are. Where it is
            not given, E alone is: whether it lies within the uncertainty cannot be said." }
    }
}

pub(super) fn layers(run: &Run<'_>, figures: &[Drawn]) -> Markup {
    let layered = |name: &Option<String>| {
        let scene = name.as_deref().and_then(|name| run.suite.scenes.get(name));
        scene.and_then(|scene| scene.concrete()).is_some_and(|concrete| !concrete.layers.is_empty())
    };
    let mut groups: Vec<(&str, Vec<Verdict>)> = Vec::new();
    for judged in run.judged.iter().filter(|judged| layered(&judged.claim.scene)) {
        match groups.iter_mut().find(|(table, _)| *table == judged.claim.table) {
            Some((_, verdicts)) => verdicts.push(judged.verdict),
            None => groups.push((&judged.claim.table, vec![judged.verdict])),
        }
    }
    section(
        "layers",
        html! {
            p { "A target of layers has no formula, but each layer has: the closed form goes on piece by piece, and every
                boundary is an event. The crater constant c follows from the layer that lies at and behind x = k d." }
            (figures_of(run, figures, Part::Layers))
            @if groups.is_empty() { p { "This suite claims nothing of this kind." } }
            @else {
                @let all = Counts::of(groups.iter().flat_map(|(_, verdicts)| verdicts.iter().copied()));
                details {
                    summary { "What is claimed of layered scenes, all over this report: " (tally(all)) }
                    table.cards {
                        thead { tr { th scope="col" { "claims" } th scope="col" { "verdict" } } }
                        tbody { @for (table, verdicts) in &groups { tr {
                            @let counts = Counts::of(verdicts.iter().copied());
                            th scope="row" { code { (one_line(table)) } }
                            td data-label="verdict" {
                                (badge(if counts.skipped == verdicts.len() { Verdict::Skipped } else { counts.verdict() }))
                                " " span.quiet { (tally(counts)) }
                            }
                        } } }
                    }
                }
            }
        },
    )
}

pub(super) fn sensitivities(families: &[Family<'_>]) -> Markup {
    section(
        "sensitivities",
        html! {
            p { "How depth, residual and critical velocity answer to every number of a scene: derivatives by dual numbers
                through the closed form and, by a road that shares nothing with it but the scene, through the integrators." }
            (results("Elasticities beside those of the closed form", families, Kind::Sensitivity))
        },
    )
}
