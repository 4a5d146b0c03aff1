//! What the claims of a suite cover: families, terms of the force and events against methods and quantities.

use maud::{Markup, html};

use super::Run;
use super::figures::words_for;
use super::study::{Cell, Prose, Sheet};
use crate::integrators::{Detail, Integrator, MethodName, Taylor};
use crate::studies::Quantity;
use crate::studies::diagnosis::{Content, contents};
use crate::suite::{Check, Counts, Judged, Section, Verdict, grouped};

/// The method that a claim is about: what is claimed of orders and steps is claimed of the central difference.
fn method_of(judged: &Judged) -> Option<MethodName> {
    let claim = &judged.claim;
    let is_of_steps =
        matches!(claim.section, Section::Orders | Section::Constants | Section::Solution | Section::Stability)
            || matches!(claim.check, Check::Order(_));
    claim.method.or(is_of_steps.then_some(MethodName::CentralDifference))
}

/// How many of `judged` passed, and of how many that were measured where some did not.
fn cell<'a>(judged: impl IntoIterator<Item = &'a Judged>) -> Cell {
    let Counts { passed, failed, undecided, .. } = Counts::of_claims(judged);
    if passed > 0 && failed + undecided == 0 { whole(passed) } else { Cell::Of(passed, passed + failed + undecided) }
}

fn whole(number: usize) -> Cell {
    Cell::Number(Some(number as f64), 7)
}

/// The tables; nothing where nothing was claimed.
pub(super) fn tables(run: &Run<'_>) -> Markup {
    let judged = run.judged;
    if judged.is_empty() {
        return html! {};
    }
    let methods: Vec<MethodName> =
        MethodName::ALL.iter().copied().filter(|method| judged.iter().any(|j| method_of(j) == Some(*method))).collect();
    let quantities: Vec<Quantity> = Quantity::ALL
        .into_iter()
        .filter(|quantity| judged.iter().any(|j| j.claim.quantity == Some(*quantity)))
        .collect();
    let not_claimed = "A dash: nothing is claimed, or all of it was skipped.";
    html! {
        p { "Each number is how many claims passed, and of how many where some did not; a claim counts once, and its cases are not counted. "
            (not_claimed) }
        (families(judged, &methods).to_html(&[]))
        @let rows = rows_by_content(run);
        @if !rows.is_empty() {
            @let by_method = |content: &(Content, Vec<&Judged>)| methods.iter().map(|method| {
                cell(content.1.iter().copied().filter(|j| method_of(j) == Some(*method)))
            }).collect::<Vec<_>>();
            @let by_quantity = |content: &(Content, Vec<&Judged>)| quantities.iter().map(|quantity| {
                cell(content.1.iter().copied().filter(|j| j.claim.quantity == Some(*quantity)))
            }).collect::<Vec<_>>();
            p { "The path of a scene meets terms of the force and events. A claim stands in every row that its scene meets; the random "
                "scenes of a claim without a scene are in no row." }
            (matrix("terms-methods", "Terms of the force and events against methods", methods.iter().map(|m| m.name()), &rows, by_method)
                .to_html(&[]))
            @if !quantities.is_empty() {
                (matrix("terms-quantities", "Terms of the force and events against quantities", quantities.iter().map(|q| words_for(*q)), &rows,
                    by_quantity).to_html(&[]))
            }
        }
    }
}

/// Families of claims, by the first part of their ids, against methods.
fn families(judged: &[Judged], methods: &[MethodName]) -> Sheet {
    let caption = "Families of claims against methods".into();
    let header = ["family", "asked", "skipped", "not passed", "no method"];
    let header = header.into_iter().chain(methods.iter().map(|method| method.name())).map(Prose::text);
    let groups = grouped(judged, |judged| judged.claim.group());
    let sheet = Sheet::grid("families", caption, header);
    let sheet = sheet.rows(&groups, |(name, members)| {
        let counts = Counts::of_claims(members.iter().copied());
        let Counts { failed, undecided, skipped, .. } = counts;
        let of = |method: Option<MethodName>| cell(members.iter().copied().filter(move |j| method_of(j) == method));
        let heads = [Cell::code(name), whole(members.len()), whole(skipped), whole(failed + undecided), of(None)];
        heads.into_iter().chain(methods.iter().map(|method| of(Some(*method)))).collect::<Vec<_>>()
    });
    let all = Counts::of_claims(judged);
    let open = judged.iter().filter(|j| matches!(j.verdict, Verdict::Failed | Verdict::Undecided)).count();
    let heads = [Cell::text("all"), whole(judged.len()), whole(all.skipped), whole(open)];
    let of = |method: Option<MethodName>| cell(judged.iter().filter(move |j| method_of(j) == method));
    sheet.row(heads.into_iter().chain([of(None)]).chain(methods.iter().map(|method| of(Some(*method)))))
}

/// The claims whose scenes meet a term or an event, for each that is met.
fn rows_by_content<'a>(run: &Run<'a>) -> Vec<(Content, Vec<&'a Judged>)> {
    let with_scene = run.judged.iter().filter_map(|judged| Some((judged.claim.scene.as_deref()?, judged)));
    let scenes: Vec<(Vec<Content>, Vec<&Judged>)> = grouped(with_scene, |(scene, _)| *scene)
        .into_iter()
        .filter_map(|(name, members)| {
            let problem = run.suite.scenes.problem(name).ok()?;
            let flight = Taylor::default().solve(problem, Detail::Events).ok()?;
            let met = contents(problem, run.suite.scenes.get(name), &flight);
            Some((met, members.into_iter().map(|(_, judged)| judged).collect()))
        })
        .collect();
    let row = |content: Content| {
        let meeting = scenes.iter().filter(|(met, _)| met.contains(&content));
        (content, meeting.flat_map(|(_, members)| members.iter().copied()).collect::<Vec<_>>())
    };
    let all = Content::TERMS.into_iter().chain(Content::EVENTS).map(row);
    all.filter(|(_, members)| !members.is_empty()).collect()
}

/// Rows of contents against columns.
fn matrix<'a>(
    name: &str,
    caption: &'static str,
    columns: impl Iterator<Item = &'static str>,
    rows: &[(Content, Vec<&'a Judged>)],
    cells: impl Fn(&(Content, Vec<&'a Judged>)) -> Vec<Cell>,
) -> Sheet {
    let header = ["the path meets", "claims"].into_iter().chain(columns).map(Prose::text);
    Sheet::grid(name, caption.into(), header).rows(rows, |row| {
        let heads = [Cell::text(row.0.words()), cell(row.1.iter().copied())];
        heads.into_iter().chain(cells(row)).collect::<Vec<_>>()
    })
}
