//! The page of `verify`: what is solved, how it was verified, and where it was not tried.

use maud::{Markup, Render, html};

use super::cells;
use super::chart::extremes;
use super::figure::Figure;
use super::figures::{fit_of, scenes_in_order, words_for};
use super::page::{Page, Table, cell, claims_table, counts_cell, facts, folded, number_cell, sign, slot, tally};
use super::text::{count, number, one_line};
use super::{Environment, Run, coverage, nomenclature, typeset};
use crate::integrators::{Boundaries, MethodName, Taylor, VelocityAt};
use crate::physics::groups::Groups;
use crate::studies::experiments;
use crate::studies::sweep::{WHY, conclusions, explanation};
use crate::studies::{Path, Quantity, Stretch, formal_order};
use crate::suite::checks::{FIXED, Order, StepPattern};
use crate::suite::{
    Check, Counts, Evidence, Judged, LOOSENESS_MAX, SeededFault, grouped, looseness, seeded_faults, skipped, tables,
};

/// The page of `run` with its figures.
pub(super) fn to_html(run: &Run<'_>, figures: &[Figure]) -> String {
    let filled = |name: &str, words: &str| match name {
        "nomenclature" => nomenclature::table().render(),
        "coverage" => coverage::tables(run),
        "scenes" => scenes(run),
        "formal-orders" => formal_orders(),
        "build" => build(&run.environment),
        "observed-orders" => observed_orders(run),
        "peers" => facts(run.environment.peers.iter().map(|(name, text)| (name.as_str(), typeset::html(text)))),
        "why-above-eq-15" => why_above_eq15(run),
        "sets" => sets(run),
        "meaning-of-data" => html! { p { (typeset::html(experiments::MEANING)) } },
        "layered-claims" => layered_claims(run),
        "faults" if run.suite.is_embedded => faults(&run.environment),
        "faults" => html! {},
        "headline" => headline(run.judged),
        "why-skipped" => why_skipped(run.judged),
        "deviations" => deviations(run.judged),
        "of-the-paper" => of_the_paper(),
        _ => slot(run, figures, name, words),
    };
    let purpose = "Purpose: to show what the program computes right, how far, and where it was not tried.";
    let files = html! {
        a href="report.json" { "JSON" } ", " a href="junit.xml" { "JUnit XML" } ", " a href="summary.md" { "Markdown" }
    };
    let page = Page::of_run(run, purpose, include_str!("pages/verify.txt"), &filled, files);
    Page { subject: subject(run, "claim"), ..page }.to_html()
}

/// What was judged, and by how many claims, which are called `noun`.
pub(super) fn subject(run: &Run<'_>, noun: &str) -> Markup {
    let scenes = grouped(run.judged.iter().filter_map(|judged| judged.claim.scene.as_deref()), |scene| *scene).len();
    let methods = grouped(run.judged.iter().filter_map(|judged| judged.claim.method), |method| *method).into_iter();
    let methods: Vec<_> = methods.map(|(method, _)| method.name()).collect();
    let programs = grouped(peers(run.judged), |(name, ..)| *name).len();
    html! {
        "Judged: penetrode " (run.environment.version)
        @if !methods.is_empty() { ", its " (if methods.len() == 1 { "method " } else { "methods " }) (methods.join(", ")) }
        ", by " (count(run.judged.len(), noun)) @if scenes > 0 { " on " (count(scenes, "scene")) }
        @if programs > 0 { ", and beside " (count(programs, "other program")) } "."
    }
}

/// The claims that compare with another program: its name, the difference, and the claim.
fn peers(judged: &[Judged]) -> impl Iterator<Item = (&str, f64, &Judged)> {
    judged.iter().filter_map(|judged| match (&judged.claim.check, judged.measured) {
        (Check::Peer(peer), Some(measured)) => Some((<&str>::from(peer.name), measured, judged)),
        _ => None,
    })
}

/// The numbers that are read first: errors against the exact answer, orders, and other programs.
fn headline(judged: &[Judged]) -> Markup {
    let exact = |is_critical: bool| {
        let is_of = move |j: &&Judged| {
            let is_of_critical = j.claim.quantity == Some(Quantity::CriticalVelocity);
            matches!(j.claim.check, Check::Agreement(_)) && is_of_critical == is_critical
        };
        let errors = judged.iter().filter(is_of).filter_map(|j| Some((j.claim.method?, j.measured?)));
        let mut methods: Vec<(MethodName, f64)> = grouped(errors, |(method, _)| *method)
            .into_iter()
            .filter_map(|(method, errors)| Some((method, errors.into_iter().map(|(_, e)| e).max_by(f64::total_cmp)?)))
            .collect();
        methods.sort_by(|a, b| b.1.total_cmp(&a.1));
        methods
    };
    let error = |label: &str, methods: &[(MethodName, f64)]| {
        let (worst, best) = (methods.first()?, methods.last()?);
        let note = html! {
            "relative to the exact answer and its conditioning, by " (worst.0.name())
            @if worst.0 != best.0 { "; " (best.0.name()) ": " (number(best.1, 2)) }
        };
        Some((label.to_owned(), number(worst.1, 2), note))
    };
    let orders = || {
        let is_order = |j: &&Judged| matches!(j.claim.check, Check::Order(_));
        let fits = judged.iter().filter(is_order).filter_map(fit_of);
        let mut fits: Vec<_> = fits.filter_map(|(formal, fit)| Some((formal, fit.line?.order))).collect();
        fits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let number_of_fits = fits.len();
        let groups = grouped(fits, |(formal, _)| *formal);
        let formal: Vec<_> = groups.iter().map(|(formal, _)| number(*formal, 2)).collect();
        let ranges = groups.iter().filter_map(|(_, fits)| extremes(fits.iter().map(|(_, order)| *order)));
        let ranges: Vec<_> = ranges.map(|[low, high]| format!("{low:.2} to {high:.2}")).collect();
        let note = html! {
            "observed in " (count(number_of_fits, "fit")) "; formal: " (formal.join(", "))
        };
        (!ranges.is_empty()).then(|| ("Orders in the step".to_owned(), ranges.join(", "), note))
    };
    let others = || {
        let (name, worst, claim) = peers(judged).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let programs = grouped(peers(judged), |(name, ..)| *name).len();
        let note = html! {
            "of the tolerance, " (one_line(name)) "; limit " (number(claim.claim.limit, 2)) "; " (count(programs, "program"))
        };
        Some(("Farthest from another program".to_owned(), number(worst, 2), note))
    };
    let shown = [
        error("Largest error of the solvers", &exact(false)),
        error("Largest error of V_c", &exact(true)),
        orders(),
        others(),
    ];
    let shown: Vec<_> = shown.into_iter().flatten().collect();
    html! { @if !shown.is_empty() { ul.counts.headline {
        @for (label, value, note) in shown { li { span.quiet { (typeset::html(&label)) } b { (value) } span.quiet { (note) } } }
    } } }
}

/// Why claims were skipped, in a line: the two reasons of most claims, and how many have another.
fn why_skipped(judged: &[Judged]) -> Markup {
    let mut reasons = skipped(judged);
    // Stable: among equals the first that occurred.
    reasons.sort_by_key(|(_, claims)| std::cmp::Reverse(*claims));
    let (named, others) = reasons.split_at(reasons.len().min(2));
    let others: usize = others.iter().map(|(_, claims)| claims).sum();
    html! { @if !named.is_empty() { p.quiet {
        "Skipped: "
        @for (index, (reason, claims)) in named.iter().enumerate() {
            @if index > 0 { "; " }
            (one_line(reason))
            @if *reason == FIXED { ", as it does the speed at rest and the depth at the exit" }
            " (" (claims) ")"
        }
        @if others > 0 { "; " a href="#deviations" { "other reasons" } " (" (others) ")" }
        "."
    } } }
}

/// Methods that this build leaves out, and for what it was built.
fn build(e: &Environment) -> Markup {
    let missing: Vec<_> = MethodName::ALL.iter().filter(|m| !m.is_built()).map(|m| m.name()).collect();
    html! {
        @if !missing.is_empty() { p { "This build leaves out " (missing.join(", ")) "; their claims are skipped." } }
        p.quiet { "Built for " (e.target) " by " (e.rustc) "." }
    }
}

fn why_above_eq15(run: &Run<'_>) -> Markup {
    let swept = run.judged.iter().find_map(|judged| match &judged.evidence {
        Some(Evidence::Sweep { plan, rows }) => Some((plan, rows)),
        _ => None,
    });
    // One a table: several methods conclude the same.
    let claimed = tables(run.judged).filter_map(|claims| match &claims.first()?.evidence {
        Some(Evidence::Conclusion(found)) => Some(found.clone()),
        _ => None,
    });
    let mut concluded: Vec<_> = claimed.collect();
    if let Some((plan, rows)) = swept.filter(|_| concluded.is_empty()) {
        let measured = plan.beside(run.points, &Taylor::default()).unwrap_or_default();
        concluded = conclusions(rows, &measured);
    }
    let why = swept.map(|(plan, rows)| explanation(plan, rows));
    html! {
        @if let Some(why) = why {
            h3 { (WHY) }
            p { (typeset::html(why.strip_prefix(WHY).unwrap_or(&why).trim_start_matches(". "))) }
        }
        @if !concluded.is_empty() {
            h3 { "What becomes of the paper's conclusions" }
            (Table::cards("", ["conclusion", "here", "by which numbers, or why not"]).rows(concluded, |found| {
                [typeset::html(found.statement), cell(found.standing.to_string()), typeset::html(&found.reason)]
            }))
        }
    }
}

/// The tables of the suite that claim something of layered scenes.
fn layered_claims(run: &Run<'_>) -> Markup {
    let layered = run.judged.iter().filter(|judged| {
        let scene = judged.claim.scene.as_deref().and_then(|name| run.suite.scenes.get(name));
        scene.and_then(|scene| scene.concrete()).is_some_and(|concrete| !concrete.layers.is_empty())
    });
    let all = Counts::of_claims(layered.clone());
    let groups = grouped(layered, |judged| judged.claim.table.as_str());
    let table = Table::cards("", ["claims", "verdict"])
        .rows(groups, |(name, claims)| [html! { code { (one_line(name)) } }, counts_cell(Counts::of_claims(claims))]);
    html! {
        @if all == Counts::default() { p { "This suite claims nothing of this kind." } }
        @else { (folded(html! { "What is claimed of layered scenes, all over this report: " (tally(all)) }, true, table)) }
    }
}

fn scenes(run: &Run<'_>) -> Markup {
    let resolved: Vec<_> = scenes_in_order(run)
        .into_iter()
        .filter_map(|name| Some((run.suite.scenes.get(&name)?, run.suite.scenes.problem(&name).ok()?, name)))
        .collect();
    let stages = "stages: p [N], s [N/m], r [kg/s], q [kg/m], until x [m]";
    let header = ["scene", "M [kg]", "V₀ [m/s]", "exit depth [m]", "I", "N", stages];
    let table = Table::grid("Parameters of the scenes", header).rows(&resolved, |(scene, problem, name)| {
        let groups = Groups::of(scene, problem.impact_speed);
        [
            html! { code { (one_line(name)) } },
            number_cell(Some(problem.mass), 6),
            number_cell(Some(problem.impact_speed), 6),
            number_cell(Some(problem.exit_depth), 6),
            number_cell(groups.as_ref().map(|groups| groups.impact), 5),
            number_cell(groups.map(|groups| groups.geometry.unwrap_or(f64::INFINITY)), 5),
            html! { @for (index, s) in problem.stages.iter().enumerate() {
                @if index > 0 { br; }
                @if problem.laws.of(index).is_some() { "a law of the scene, until " (number(s.end, 6)) }
                @else { ([s.static_force, s.stiffness, s.viscosity, s.drag, s.end].map(|value| number(value, 6)).join(", ")) }
            } },
        ]
    });
    let summary = html! { "Parameters of " (count(resolved.len(), "scene")) ", in SI units" };
    html! { @if !resolved.is_empty() { (folded(summary, false, table)) } }
}

const SMOOTH: Stretch =
    Stretch { velocity_dependent: false, force_jumps: false, of_sharp_end: None, of_sharp_place: None };
/// The kinds of path that decide an order, in the order of the table.
const PATHS: [(&str, bool, Stretch); 4] = [
    ("rest in the crater", false, SMOOTH),
    ("tunnel without drag", true, SMOOTH),
    ("tunnel with drag", true, Stretch { velocity_dependent: true, ..SMOOTH }),
    ("tunnel with drag, force jumps at k d", true, Stretch { velocity_dependent: true, force_jumps: true, ..SMOOTH }),
];

fn formal_orders() -> Markup {
    let header = ["path", "velocity", "boundaries"].into_iter().chain(Quantity::ALL.map(words_for));
    let mut table = Table::grid("Formal orders of the central difference (Eq. 6-8) in the step", header)
        .id("table-formal-orders")
        .numbers(3..9);
    for (path, leaves_crater, to_end) in PATHS {
        for boundaries in Boundaries::ALL {
            // One row for all velocity rules of the same orders, for a stop and for an exit together.
            let to_crater_end = leaves_crater.then(Stretch::default);
            let orders = |velocity: &VelocityAt| {
                Quantity::ALL.map(|quantity| {
                    let perforates = matches!(quantity, Quantity::Velocity | Quantity::CriticalVelocity);
                    let path = Path { perforates, to_crater_end, to_end, ..Path::default() };
                    (leaves_crater || !perforates)
                        .then(|| formal_order(*velocity, boundaries, &path, quantity))
                        .flatten()
                })
            };
            for (orders, rules) in grouped(VelocityAt::ALL, orders) {
                let names: Vec<_> = rules.iter().map(ToString::to_string).collect();
                let velocities =
                    if names.len() == VelocityAt::ALL.len() { "any".to_owned() } else { names.join(" or ") };
                let names = [cell(path), cell(velocities), cell(boundaries)];
                table = table.row(names.into_iter().chain(orders.map(|order| number_cell(order, 2))));
            }
        }
    }
    table.render()
}

/// Scene by scene: variants of the scheme against quantities.
fn observed_orders(run: &Run<'_>) -> Markup {
    let is_order = |j: &&Judged| matches!(j.claim.check, Check::Order(Order { steps: StepPattern::Uniform, .. }));
    let orders: Vec<&Judged> = run.judged.iter().filter(is_order).filter(|j| fit_of(j).is_some()).collect();
    let scenes = scenes_in_order(run).into_iter().map(|scene| {
        let mine = orders.iter().copied().filter(|j| j.claim.scene.as_ref() == Some(&scene)).collect::<Vec<_>>();
        (one_line(&scene), mine)
    });
    html! { @for (index, (scene, mine)) in scenes.filter(|(_, mine)| !mine.is_empty()).enumerate() {
        details open[index == 0] { summary { "Observed orders, scene " code { (scene) } } (order_table(&scene, &mine)) }
    } }
}

fn order_table(scene: &str, mine: &[&Judged]) -> Table {
    let quantities: Vec<_> =
        Quantity::ALL.into_iter().filter(|q| mine.iter().any(|j| j.claim.quantity == Some(*q))).collect();
    let caption =
        format!("Scene {scene}: observed order, half-width of its 95 % interval, and the formal order in brackets");
    let header = ["velocity", "boundaries"].into_iter().chain(quantities.iter().map(|q| words_for(*q)));
    let mut variants = grouped(mine.iter().copied(), |j| j.claim.rules());
    variants.sort_by_key(|((velocity, boundaries), _)| (*velocity as usize, *boundaries as usize));
    Table::grid(caption, header).numbers(2..9).rows(variants, |((velocity, boundaries), members)| {
        let of = |quantity: &Quantity| members.iter().find(|j| j.claim.quantity == Some(*quantity)).copied();
        let orders = quantities.iter().map(|quantity| of(quantity).map_or_else(|| cell("—"), order_cell));
        [cell(velocity), cell(boundaries)].into_iter().chain(orders).collect::<Vec<_>>()
    })
}

fn order_cell(judged: &Judged) -> Markup {
    html! {
        @if let Some((formal, fit)) = fit_of(judged) {
            @if let Some(line) = fit.line {
                (format!("{:.2} ± {:.2} ({formal})", line.order, 0.5 * (line.interval95[1] - line.interval95[0])))
            } @else { "no fit (" (formal) ")" }
            " " span.(judged.verdict.name()) aria-label=(judged.verdict.name()) role="img" { (sign(judged.verdict)) }
        }
    }
}

/// Median and spread of each set of experiments, and the terms of ASME V&V 20.
fn sets(run: &Run<'_>) -> Markup {
    let comparisons = run.judged.iter().find_map(|judged| match &judged.evidence {
        Some(Evidence::Depths(comparisons)) => Some(comparisons.as_slice()),
        _ => None,
    });
    let Some(comparisons) = comparisons else { return html! {} };
    let caption = "Predicted over measured depth, set by set; E = S − D is the comparison error after ASME V&V 20";
    let sets = experiments::summaries(comparisons);
    html! {
        (Table::cards(caption, cells::SETS).numbers(1..10).rows(cells::sets(&sets), |row| {
            row.map(|text| if text == "-" { cell("—") } else { typeset::html(&text) })
        }))
        (facts(cells::uncertainties(comparisons).map(|(name, known)| (name, typeset::html(&known)))))
    }
}

/// The faults that were built into copies of the program, and which claims noticed.
fn faults(e: &Environment) -> Markup {
    let seeded = seeded_faults().unwrap_or_default();
    let (thin, others): (Vec<_>, Vec<_>) = seeded.iter().partition(|fault| fault.is_thin());
    html! { @if !seeded.is_empty() {
        p { "All " (count(seeded.len(), "fault")) " were noticed; of " (others.len()) " more than one table of claims is recorded. The record is that of commit " code { (e.commit) } "." }
        @for (faults, by) in [(thin, "one recorded table of claims: without it they may pass"), (others, "two recorded tables or more")] {
            @if !faults.is_empty() { (folded(html! { (count(faults.len(), "fault")) " noticed by " (by) }, true, faults_table(&faults))) }
        }
    } }
}

fn faults_table(faults: &[&SeededFault]) -> Table {
    let header = ["fault", "what is wrong", "source file", "noticed by, at most five"];
    Table::cards("", header).rows(faults, |fault| {
        let quickest = html! { @for (index, table) in fault.noticed_by.iter().enumerate() {
            @if index > 0 { ", " }
            code { (one_line(table)) }
        } };
        // A path breaks between its parts.
        let file = html! { @for part in fault.file.split_inclusive('/') { (one_line(part)) wbr; } };
        [html! { code { (one_line(&fault.id)) } }, typeset::html(&fault.what), file, quickest]
    })
}

/// The table of docs/theory.md that says where each part of the paper is, or why it is not.
fn of_the_paper() -> Markup {
    let section = include_str!("../../docs/theory.md")
        .split("\n## ")
        .find(|section| section.contains("What of the paper is where"));
    let rows = section
        .unwrap_or_default()
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | "));
    Table::cards("The paper, part by part", ["in the paper", "here"])
        .rows(rows.skip(1), |(part, here)| [part, here].map(typeset::html))
        .render()
}

fn deviations(judged: &[Judged]) -> Markup {
    let open: Vec<_> = judged.iter().filter(|j| j.is_open()).collect();
    let reasons = skipped(judged);
    let loose: Vec<_> = looseness(judged).into_iter().filter(|(_, times)| *times > LOOSENESS_MAX).collect();
    html! {
        @if open.is_empty() { p { "No claim failed and none is undecided." } }
        @else { (claims_table("Claims that failed or are undecided", open)) }
        @if !reasons.is_empty() {
            h3 { "Skipped, and why" }
            ul { @for (reason, number) in reasons { li { (one_line(reason)) " (" (count(number, "claim")) ")" } } }
        }
        @if !loose.is_empty() {
            h3 { "Limits that guard little" }
            p { "More than " (LOOSENESS_MAX) " times what was measured in every scene:" }
            ul { @for (id, times) in &loose { li { code { (one_line(id)) } ", " (number(*times, 2)) " times" } } }
        }
    }
}
