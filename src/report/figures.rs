//! Which figures a run has: from the evidence of its claims, and the paths of its scenes.
//!
//! A figure appears where its evidence is; a suite of other scenes gets its own. Its message is what the verdicts of
//! the claims behind it allow, no more.

use std::f64::consts::FRAC_PI_4;

use super::Run;
use super::chart::{Anchor, Axis, HEIGHT, Ink, Key, KeyPlace, MARGINS, Mark, Panel, RADIUS, Scale, Shape};
use super::families::Family;
use super::figure::{Figure, Part};
use super::figure_data::path_of;
use super::table::{Table, or_empty};
use super::text::{count, number};
use super::{stability_figures, sweep_figures};
use crate::integrators::{Boundaries, Flight, Sample, VelocityAt};
use crate::physics::semi_empirical::{depth_ratio, model_difference};
use crate::physics::{EventKind, Outcome, Problem};
use crate::studies::Quantity;
use crate::studies::order::{Exclusion, FittedPoint, OrderFit};
use crate::suite::claim::StepPattern;
use crate::suite::{Check, Evidence, Judged, Verdict};

/// Scenes whose paths are shown at most, and scenes whose errors are.
const SCENES_MAX: usize = 2;

/// Every figure of `run`, in the order of the report.
pub fn all(run: &Run<'_>) -> Vec<Figure> {
    let mut figures = Vec::new();
    figures.extend(paths(run));
    figures.extend(approach(run));
    figures.extend(observed_orders(run));
    let mut scenes = scenes_by_variants(run, Quantity::Depth);
    scenes.truncate(SCENES_MAX);
    figures.extend(scenes.iter().filter_map(|scene| errors_over_step(run, scene, Quantity::Depth)));
    figures.extend(tolerances(run));
    let scenes = scenes_by_variants(run, Quantity::CraterEndTime);
    figures.extend(scenes.first().and_then(|scene| errors_over_step(run, scene, Quantity::CraterEndTime)));
    figures.extend(energy(run));
    figures.extend(peers(run));
    figures.extend(of_evidence(run));
    figures.extend(layers(run));
    figures
}

/// Figures that show the evidence of one claim; the first claim that has it gives it, all of its kind judge it.
fn of_evidence(run: &Run<'_>) -> Vec<Figure> {
    let mut figures: Vec<Figure> = Vec::new();
    for judged in run.judged {
        let drawn = match &judged.evidence {
            Some(Evidence::Boundary(points)) => vec![stability_figures::boundary(points)],
            Some(Evidence::Rounding(rows)) => vec![stability_figures::rounding(rows)],
            Some(Evidence::Sweep { rows, .. }) => {
                vec![sweep_figures::critical_energy(rows, run.points), sweep_figures::critical_energy_difference(rows)]
            }
            Some(Evidence::Map { crater_ratio, lines, scenes }) => {
                vec![Some(sweep_figures::applicability(*crater_ratio, lines, scenes))]
            }
            Some(Evidence::Depths(comparisons)) => vec![sweep_figures::measured_depths(comparisons)],
            Some(Evidence::Fit { .. } | Evidence::Series { .. }) | None => Vec::new(),
        };
        let claims = ids(run, [judged]);
        for mut figure in drawn.into_iter().flatten() {
            if !figures.iter().any(|known| known.name == figure.name) {
                figure.claims.clone_from(&claims);
                figures.push(figure);
            }
        }
    }
    figures
}

/// The fit behind a claim, with the order expected.
pub fn fit_of(judged: &Judged) -> Option<(&'static str, f64, &OrderFit)> {
    match &judged.evidence {
        Some(Evidence::Fit { abscissa, formal, fit }) => Some((abscissa, *formal, fit)),
        _ => None,
    }
}

/// Colour of a verdict.
fn ink_of(verdict: Verdict) -> Ink {
    match verdict {
        Verdict::Passed => Ink::Blue,
        Verdict::Skipped => Ink::Muted,
        Verdict::Undecided => Ink::Orange,
        Verdict::Failed => Ink::Red,
    }
}

/// `good` if every claim passed, else how many did not.
fn message<'a>(judged: impl IntoIterator<Item = &'a Judged>, subject: &str, good: &str, bad: &str) -> String {
    let judged: Vec<_> = judged.into_iter().collect();
    let not = judged.iter().filter(|j| j.verdict != Verdict::Passed).count();
    if not == 0 {
        format!("{subject} {good}")
    } else {
        format!("{subject} {bad} ({not} of {})", count(judged.len(), "claim"))
    }
}

fn reason_of(excluded: Option<Exclusion>) -> &'static str {
    match excluded {
        None => "",
        Some(Exclusion::ZeroError) => "zero-error",
        Some(Exclusion::RoundOffFloor) => "round-off-floor",
        Some(Exclusion::PreAsymptotic) => "pre-asymptotic",
    }
}

/// The points of a fit as marks: hollow where excluded. Errors of zero have no place on a logarithmic axis.
fn points_of(fit: &OrderFit, ink: Ink, shape: Shape, radius: f64) -> [Mark; 2] {
    let chosen = |used: bool| -> Vec<(f64, f64)> {
        let wanted = |p: &&FittedPoint| p.used == used && p.error != 0.0;
        fit.points.iter().filter(wanted).map(|p| (p.step, p.error.abs())).collect()
    };
    [
        Mark::Points { points: chosen(false), ink, shape, hollow: true, radius },
        Mark::Points { points: chosen(true), ink, shape, hollow: false, radius },
    ]
}

/// The ways through the fits' axes below which an error is round-off: its own estimate, `eps` times the steps.
fn floor(x: &Axis, y: &Axis, coarsest: f64) -> Option<[Mark; 2]> {
    let size = |step: f64| f64::EPSILON * coarsest / step;
    let bottom = y.range[0];
    if size(x.range[0]) <= bottom {
        return None;
    }
    // Where the floor falls below the panel.
    let end = (f64::EPSILON * coarsest / bottom).min(x.range[1]);
    let points = vec![(x.range[0], bottom), (x.range[0], size(x.range[0])), (end, size(end)), (end, bottom)];
    let at = (x.range[0] * (x.range[1] / x.range[0]).powf(0.02), bottom * (y.range[1] / bottom).powf(0.04));
    Some([
        Mark::Area { points, ink: Ink::Shade },
        Mark::Text { at, text: "round-off".into(), ink: Ink::Muted, anchor: Anchor::Start },
    ])
}

/// A line of slope `slope` through a point, as far as the panel of two logarithmic axes goes, and its name.
struct Reference {
    slope: f64,
    through: (f64, f64),
    name: String,
}

impl Reference {
    fn at(&self, x: f64) -> f64 {
        self.through.1 * (x / self.through.0).powf(self.slope)
    }

    fn ends(&self, x: &Axis, y: &Axis) -> [f64; 2] {
        let back = |error: f64| self.through.0 * (error / self.through.1).powf(1.0 / self.slope);
        [x.range[0].max(back(y.range[0])), x.range[1].min(back(y.range[1]))]
    }
}

/// The lines, each with its name beside it where no point and no other line is.
fn references(lines: &[Reference], points: &[(f64, f64)], x: &Axis, y: &Axis) -> Vec<Mark> {
    /// Size of a name and its distance from its line, as shares of the panel.
    const WIDTH: f64 = 0.17;
    const HEIGHT: f64 = 0.07;
    const GAP: f64 = 0.015;
    let mut marks = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let [low, high] = line.ends(x, y);
        marks.push(Mark::Line {
            points: vec![(low, line.at(low)), (high, line.at(high))],
            ink: Ink::Muted,
            dashed: true,
        });
        let width = WIDTH * line.name.chars().count() as f64 / 7.0;
        let along = |share: f64| low * (high / low).powf(share);
        let others = lines.iter().enumerate().filter(|(other, _)| *other != index);
        let obstacles: Vec<(f64, f64)> = points
            .iter()
            .copied()
            .chain(
                others
                    .flat_map(|(_, other)| (0..100).map(move |i| along(f64::from(i) / 99.0)).map(|x| (x, other.at(x)))),
            )
            .map(|(px, py)| (x.share(px), y.share(py)))
            .collect();
        // Above the line to the left of the place, or below it to the right: the line rises.
        let places = (1..18).flat_map(|i| [(f64::from(i) * 0.05, true), (f64::from(i) * 0.05, false)]);
        let crowd = |(share, above): (f64, bool)| {
            let (u, v) = (x.share(along(share)), y.share(line.at(along(share))));
            let (left, bottom) = if above { (u - width, v + GAP) } else { (u, v - GAP - HEIGHT) };
            let inside = left >= 0.0 && left + width <= 1.0 && bottom >= 0.0 && bottom + HEIGHT <= 1.0;
            let hits = obstacles
                .iter()
                .filter(|(ou, ov)| {
                    left - 0.02 < *ou && *ou < left + width + 0.02 && bottom - 0.02 < *ov && *ov < bottom + HEIGHT
                })
                .count();
            if inside { hits } else { usize::MAX }
        };
        let Some((share, above)) = places.min_by_key(|place| crowd(*place)) else { continue };
        let shift = (y.range[1] / y.range[0]).powf(GAP + 0.5 * HEIGHT);
        let at = line.at(along(share));
        marks.push(Mark::Text {
            at: (along(share), if above { at * shift } else { at / shift }),
            text: line.name.clone(),
            ink: Ink::Muted,
            anchor: if above { Anchor::End } else { Anchor::Start },
        });
    }
    marks
}

/// The order claims of `scene` and `quantity` with equal steps.
fn variants<'a>(run: &Run<'a>, scene: &str, quantity: Quantity) -> Vec<&'a Judged> {
    run.judged
        .iter()
        .filter(|j| {
            matches!(j.claim.check, Check::Order { steps: StepPattern::Uniform, .. })
                && j.claim.scene.as_deref() == Some(scene)
                && j.claim.quantity == Some(quantity)
                && fit_of(j).is_some()
        })
        .collect()
}

/// Scenes in which `quantity` has more than one formal order, most variants of the scheme first.
fn scenes_by_variants(run: &Run<'_>, quantity: Quantity) -> Vec<String> {
    let mut found: Vec<(usize, String)> = Vec::new();
    for judged in run.judged {
        let Some(scene) = &judged.claim.scene else { continue };
        if found.iter().any(|(_, known)| known == scene) {
            continue;
        }
        let variants = variants(run, scene, quantity);
        let formal = |j: &&Judged| fit_of(j).map(|(_, formal, _)| formal.to_bits());
        let mut orders: Vec<_> = variants.iter().filter_map(formal).collect();
        orders.sort_unstable();
        orders.dedup();
        if orders.len() > 1 {
            found.push((variants.len(), scene.clone()));
        }
    }
    // Stable: among equals the suite's order stays.
    found.sort_by_key(|(variants, _)| std::cmp::Reverse(*variants));
    found.into_iter().map(|(_, scene)| scene).collect()
}

/// Common beginnings of the ids of `judged`.
fn ids<'a>(run: &Run<'_>, judged: impl IntoIterator<Item = &'a Judged>) -> Vec<String> {
    let wanted: Vec<&str> = judged.into_iter().map(|j| j.claim.id.as_str()).collect();
    Family::all(run.judged)
        .iter()
        .filter(|family| family.members.iter().any(|j| wanted.contains(&j.claim.id.as_str())))
        .map(|family| family.id.to_owned())
        .collect()
}

/// Name of a quantity in a sentence.
pub fn words_for(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Depth => "depth at rest",
        Quantity::Time => "time of the end",
        Quantity::Velocity => "exit velocity",
        Quantity::CraterEndTime => "time at x = k d",
        Quantity::CraterEndVelocity => "velocity at x = k d",
        Quantity::CriticalVelocity => "critical velocity",
    }
}

/// Error against the step for every variant of the scheme, one panel a velocity rule.
fn errors_over_step(run: &Run<'_>, scene: &str, quantity: Quantity) -> Option<Figure> {
    let judged = variants(run, scene, quantity);
    let fits: Vec<_> = judged.iter().filter_map(|j| fit_of(j).map(|(_, formal, fit)| (*j, formal, fit))).collect();
    let points = || fits.iter().flat_map(|(_, _, fit)| &fit.points);
    let coarsest = points().map(|p| p.step).fold(0.0, f64::max);
    let finest = points().map(|p| p.step).fold(f64::INFINITY, f64::min);
    let largest = points().map(|p| p.error.abs()).fold(0.0, f64::max);
    if fits.is_empty() || largest <= 0.0 {
        return None;
    }
    let x = Axis::log("step [s]", [finest, coarsest]);
    // Single errors close to a change of sign lie decades below the others; they are drawn at the lower edge.
    let mut errors: Vec<f64> = points().map(|p| p.error.abs()).filter(|e| *e > 0.0).collect();
    errors.sort_by(f64::total_cmp);
    let low = errors[errors.len() / 50].min(0.03 * f64::EPSILON * coarsest / finest);
    let y = Axis::log("relative error", [low, largest * 6.0]);
    let mut table = Table::new([
        "velocity_rule",
        "boundary_rule",
        "dt_s",
        "relative_error",
        "used",
        "excluded",
        "formal_order",
        "observed_order",
        "low95",
        "high95",
    ]);
    let mut panels = Vec::new();
    for velocity in [VelocityAt::LaggedHalfStep, VelocityAt::Centred, VelocityAt::PredictedHalfStep] {
        let mine: Vec<_> = fits.iter().filter(|(j, ..)| j.claim.velocity == velocity).collect();
        if mine.is_empty() {
            continue;
        }
        let mut marks: Vec<Mark> = floor(&x, &y, coarsest).into_iter().flatten().collect();
        let mut keys = Vec::new();
        let mut seen = Vec::new();
        let through = (coarsest, largest * 3.0);
        let lines = [1.0, 2.0].map(|slope| Reference { slope, through, name: format!("slope {slope}") });
        let errors = mine.iter().flat_map(|(_, _, fit)| fit.points.iter().map(|p| (p.step, p.error.abs())));
        marks.extend(references(&lines, &errors.collect::<Vec<_>>(), &x, &y));
        for (index, boundaries) in
            [Boundaries::StepEnd, Boundaries::Interpolated, Boundaries::Landed].into_iter().enumerate()
        {
            let Some((judged, formal, fit)) = mine.iter().find(|(j, ..)| j.claim.boundaries == boundaries) else {
                continue;
            };
            let (ink, shape) = (Ink::series(index), Shape::series(index));
            // Smaller from series to series, so that one shows behind another where they coincide.
            let radius = [4.0, 3.25, 2.0][index];
            marks.extend(points_of(fit, ink, shape, radius));
            let observed = fit.line.map(|line| line.order);
            let shown = observed.map_or_else(|| "—".to_owned(), |order| format!("{order:.2}"));
            keys.push(Key { text: format!("{boundaries}: {shown}"), ink, shape: Some(shape), hollow: false });
            seen.push(format!("{boundaries} has order {shown}, formal {formal}"));
            for point in &fit.points {
                table.push([
                    &judged.claim.velocity,
                    &boundaries,
                    &point.step,
                    &point.error,
                    &point.used,
                    &reason_of(point.excluded),
                    formal,
                    &or_empty(observed),
                    &or_empty(fit.line.map(|l| l.interval95[0])),
                    &or_empty(fit.line.map(|l| l.interval95[1])),
                ]);
            }
        }
        panels.push(Panel {
            title: format!("{velocity} velocity in the drag"),
            description: format!("Relative error of the {} over the step: {}.", words_for(quantity), seen.join("; ")),
            x: x.clone(),
            y: y.clone(),
            marks,
            keys,
            key_place: KeyPlace::Corner,
            height: HEIGHT + 20,
        });
    }
    let part = if matches!(quantity, Quantity::CraterEndTime) { Part::Events } else { Part::CodeVerification };
    let subject = format!("Scene {scene}: the error of the {}", words_for(quantity));
    Some(Figure {
        name: format!("error-{}-{}", quantity.name().replace('_', "-"), slug(scene)),
        part,
        message: message(
            judged.iter().copied(),
            &subject,
            "falls with the formal order of each variant",
            "is not shown to fall with the formal order of every variant",
        ),
        reading:
            "Each point is one flight; step sizes have random ratios. Numbers beside the names are observed orders. \
                  Hollow points are outside the fit; the shaded corner is the round-off of the number of steps taken."
                .to_owned(),
        claims: ids(run, judged),
        panels,
        table,
    })
}

/// Letters, digits and hyphens of a name.
fn slug(name: &str) -> String {
    let stem = name.rsplit('/').next().unwrap_or(name).trim_end_matches(".toml");
    stem.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).take(60).collect()
}

/// Observed order with its interval beside the formal order, one row a family of claims.
fn observed_orders(run: &Run<'_>) -> Option<Figure> {
    let families = Family::all(run.judged);
    let order_of = |j: &Judged| fit_of(j).filter(|(_, _, fit)| fit.line.is_some()).map(|(_, formal, _)| formal);
    let is_order = |j: &Judged| {
        matches!(j.claim.check, Check::Order { .. } | Check::Manufactured { .. } | Check::ApproachOrder { .. })
    };
    let mut table = Table::new([
        "claim",
        "formal_order",
        "observed_order",
        "low95",
        "high95",
        "limit",
        "points_used",
        "points",
        "verdict",
    ]);
    let mut panels = Vec::new();
    let mut all = Vec::new();
    let mut formals: Vec<f64> = run.judged.iter().filter(|j| is_order(j)).filter_map(order_of).collect();
    formals.sort_by(f64::total_cmp);
    formals.dedup();
    for formal in formals {
        let rows: Vec<(&Family<'_>, Vec<&Judged>)> = families
            .iter()
            .map(|f| (f, f.members.iter().filter(|j| is_order(j) && order_of(j) == Some(formal)).collect::<Vec<_>>()))
            .filter(|(_, members)| !members.is_empty())
            .collect();
        for judged in rows.iter().flat_map(|(_, members)| members) {
            let Some((line, fit)) = fit_of(judged).and_then(|(_, _, fit)| Some((fit.line?, fit))) else { continue };
            all.push(*judged);
            table.push([
                &judged.claim.id,
                &formal,
                &line.order,
                &line.interval95[0],
                &line.interval95[1],
                &judged.claim.limit,
                &fit.used(),
                &fit.points.len(),
                &judged.verdict.name(),
            ]);
        }
        panels.push(order_panel(formal, &rows));
    }
    if panels.is_empty() {
        return None;
    }
    Some(Figure {
        name: "observed-orders".into(),
        part: Part::CodeVerification,
        message: message(
            all.iter().copied(),
            "Observed orders",
            "are the formal ones, degraded orders included",
            "are not all shown to be the formal ones",
        ),
        reading:
            "Each dot is one claim: the order of a least-squares fit, with its 95 % interval. The dashed line is the \
                  formal order, the shaded band the limit of the claim. Blue passed, orange is undecided, red failed; \
                  what lies beyond the panel is drawn at its edge."
                .to_owned(),
        claims: ids(run, all),
        panels,
        table,
    })
}

/// Families of claims of one formal order, one below the other, each member on a line of its own.
fn order_panel(formal: f64, rows: &[(&Family<'_>, Vec<&Judged>)]) -> Panel {
    // Heights [px]: of a label, of a claim, between families.
    const LABEL: f64 = 16.0;
    const LINE: f64 = 4.0;
    const GAP: f64 = 6.0;
    let mut reach = 0.3_f64;
    let mut marks = Vec::new();
    let mut top = Vec::new();
    // From the top edge downwards, one unit a pixel.
    let mut y = 0.0;
    for (family, members) in rows {
        let height = LINE * members.len().max(2) as f64;
        let limit = family.first().claim.limit.min(1.0);
        let (low, high) = (formal - limit, formal + limit);
        let text = format!("{} ({})", family.id, members.len());
        top.push(Mark::Text { at: (f64::NEG_INFINITY, y - 0.5 * LABEL), text, ink: Ink::Text, anchor: Anchor::Start });
        y -= LABEL;
        let points = vec![(low, y - height), (low, y), (high, y), (high, y - height)];
        marks.push(Mark::Area { points, ink: Ink::Shade });
        top.push(Mark::Line { points: vec![(formal, y - height), (formal, y)], ink: Ink::Muted, dashed: true });
        reach = reach.max(limit);
        for (index, judged) in members.iter().enumerate() {
            let Some((_, _, fit)) = fit_of(judged) else { continue };
            let Some(line) = fit.line else { continue };
            let y = y - height * (index as f64 + 0.5) / members.len() as f64;
            let [low, high] = line.interval95;
            let ink = ink_of(judged.verdict);
            top.push(Mark::Line { points: vec![(low, y), (high, y)], ink, dashed: false });
            let points = vec![(line.order, y)];
            top.push(Mark::Points { points, ink, shape: Shape::Circle, hollow: false, radius: 2.0 });
            reach = reach.max((line.order - formal).abs().min(1.0));
        }
        y -= height + GAP;
    }
    // What leaves the panel ends at its edge; labels begin there.
    let (left, right) = (formal - reach * 1.05, formal + reach * 1.05);
    for mark in &mut top {
        match mark {
            Mark::Line { points, .. } | Mark::Points { points, .. } => {
                for point in points {
                    point.0 = point.0.clamp(left, right);
                }
            }
            Mark::Text { at, .. } => at.0 = left,
            Mark::Area { .. } => {}
        }
    }
    marks.extend(top);
    Panel {
        title: format!("formal order {formal}"),
        description: format!("{}, each with its observed order and 95 % interval.", count(rows.len(), "row")),
        x: Axis { label: "observed order".into(), scale: Scale::Linear, range: [left, right], numbered: true },
        y: Axis { label: String::new(), scale: Scale::Linear, range: [y, 0.0], numbered: false },
        marks,
        keys: Vec::new(),
        key_place: KeyPlace::Corner,
        height: (-y) as i32 + MARGINS,
    }
}

/// Error against tolerance, one panel a method.
fn tolerances(run: &Run<'_>) -> Option<Figure> {
    let judged: Vec<_> = run
        .judged
        .iter()
        .filter(|j| matches!(j.claim.check, Check::Proportionality { .. }) && fit_of(j).is_some())
        .collect();
    let points = || judged.iter().filter_map(|j| fit_of(j)).flat_map(|(_, _, fit)| &fit.points);
    let errors: Vec<f64> = points().map(|p| p.error.abs()).filter(|e| *e > 0.0).collect();
    if errors.is_empty() {
        return None;
    }
    let limit = judged.iter().map(|j| j.claim.limit).fold(0.0, f64::max);
    let x = Axis::log("tolerance", points().map(|p| p.step));
    let y = Axis::log("relative error", errors.iter().copied().chain([x.range[0], x.range[1] * 4.0]));
    let mut table = Table::new(["method", "scene", "quantity", "rtol", "relative_error", "used", "excluded", "slope"]);
    let mut methods: Vec<_> = judged.iter().filter_map(|j| j.claim.method).collect();
    methods.dedup();
    let mut panels = Vec::new();
    for method in methods {
        let mut keys = Vec::new();
        let mine = judged.iter().filter(|j| j.claim.method == Some(method));
        let shown = mine.clone().filter_map(|j| fit_of(j)).flat_map(|(_, _, fit)| &fit.points);
        let line = Reference { slope: 1.0, through: (1.0, 1.0), name: "error = tolerance".into() };
        let mut marks = references(&[line], &shown.map(|p| (p.step, p.error.abs())).collect::<Vec<_>>(), &x, &y);
        for (index, judged) in mine.enumerate() {
            let Some((_, _, fit)) = fit_of(judged) else { continue };
            let (ink, shape) = (Ink::series(index), Shape::series(index));
            marks.extend(points_of(fit, ink, shape, RADIUS));
            let name = judged.claim.quantity.map_or("", Quantity::name);
            let slope = fit.line.map(|line| line.order);
            let shown = slope.map_or_else(|| "—".to_owned(), |slope| format!("{slope:.2}"));
            keys.push(Key { text: format!("{name}: slope {shown}"), ink, shape: Some(shape), hollow: false });
            let scene = judged.claim.scene.as_deref().unwrap_or("");
            for point in &fit.points {
                table.push([
                    &method,
                    &scene,
                    &name,
                    &point.step,
                    &point.error,
                    &point.used,
                    &reason_of(point.excluded),
                    &or_empty(slope),
                ]);
            }
        }
        let seen: Vec<_> = keys.iter().map(|key| key.text.clone()).collect();
        panels.push(Panel {
            title: method.to_string(),
            description: format!("Error over tolerance, {}.", seen.join("; ")),
            x: x.clone(),
            y: y.clone(),
            marks,
            keys,
            key_place: KeyPlace::Corner,
            height: HEIGHT,
        });
    }
    Some(Figure {
        name: "tolerance-proportionality".into(),
        part: Part::CodeVerification,
        message: message(
            judged.iter().copied(),
            "Errors",
            &format!("fall with the tolerance, with slopes within {} of 1", number(limit, 2)),
            "are not all shown to fall with the tolerance as they should",
        ),
        reading:
            "Each point is one flight. A method that keeps what is asked of it stays near the dashed line; a slope \
                  of 1 is proportional. Hollow points are outside the fit."
                .to_owned(),
        claims: ids(run, judged),
        panels,
        table,
    })
}

/// The approach to Eq. 11-12 with 1/N, with its predicted constant.
fn approach(run: &Run<'_>) -> Option<Figure> {
    let mut table =
        Table::new(["claim", "impact_function", "one_over_n", "difference_x_over_d", "predicted_x_over_d", "used"]);
    let mut panels = Vec::new();
    let mut shown = Vec::new();
    for judged in run.judged {
        let (Check::ApproachOrder { impact }, Some((_, _, fit))) = (&judged.claim.check, fit_of(judged)) else {
            continue;
        };
        // k = 2 is what these claims fly.
        let constant = model_difference(*impact, 1.0, 2.0) * depth_ratio(*impact, 2.0);
        let equation = if *impact <= 2.0 * FRAC_PI_4 { 11 } else { 12 };
        let x = Axis::log("1/N", fit.points.iter().map(|p| p.step));
        let y = Axis::log("|difference| of X/d", fit.points.iter().map(|p| p.error.abs()));
        let at = |step: f64| constant.abs() * step;
        let mut marks =
            vec![Mark::Line { points: x.range.map(|step| (step, at(step))).to_vec(), ink: Ink::Orange, dashed: false }];
        marks.extend(points_of(fit, Ink::Blue, Shape::Circle, RADIUS));
        let order = fit.line.map(|line| line.order);
        for point in &fit.points {
            table.push([&judged.claim.id, impact, &point.step, &point.error, &(constant * point.step), &point.used]);
        }
        let order = order.map_or_else(|| "—".to_owned(), |order| format!("{order:.4}"));
        panels.push(Panel {
            title: format!("to Eq. {equation} at I = {impact}"),
            description: format!(
                "Difference of X/d from Eq. {equation} over 1/N: order {order}, predicted constant {}.",
                number(constant, 4)
            ),
            x,
            y,
            marks,
            keys: vec![
                Key {
                    text: format!("flown: order {order}"),
                    ink: Ink::Blue,
                    shape: Some(Shape::Circle),
                    hollow: false,
                },
                Key {
                    text: format!("predicted: {} / N", number(constant, 4)),
                    ink: Ink::Orange,
                    shape: None,
                    hollow: false,
                },
            ],
            key_place: KeyPlace::Corner,
            height: HEIGHT,
        });
        shown.push(judged);
    }
    if panels.is_empty() {
        return None;
    }
    let constants = run.judged.iter().filter(|j| matches!(j.claim.check, Check::ApproachConstant { .. }));
    let behind: Vec<_> = shown.into_iter().chain(constants).collect();
    Some(Figure {
        name: "approach-with-n".into(),
        part: Part::Model,
        message: message(
            behind.iter().copied(),
            "Eq. 11-12",
            "is a limit, approached with order 1 in 1/N and with the predicted constant",
            "is not shown to be a limit with the predicted order and constant",
        ),
        reading:
            "Points: depth flown at finite N less Eq. 11-12. Line: the first term of the expansion in 1/N, not fitted."
                .to_owned(),
        claims: ids(run, behind),
        panels,
        table,
    })
}

/// Residual of the energy balance along the path.
fn energy(run: &Run<'_>) -> Option<Figure> {
    let mut table = Table::new(["scene", "method", "depth_m", "residual_over_initial_energy"]);
    let mut panels: Vec<Panel> = Vec::new();
    let mut behind = Vec::new();
    let evidence = |j: &Judged| match (&j.claim.check, &j.evidence) {
        (Check::EnergyBalance {}, Some(Evidence::Series { points, .. })) => Some(points.clone()),
        _ => None,
    };
    let mut scenes: Vec<&str> = Vec::new();
    for judged in run.judged.iter().filter(|j| evidence(j).is_some()) {
        let scene = judged.claim.scene.as_deref().unwrap_or("");
        if !scenes.contains(&scene) {
            scenes.push(scene);
        }
    }
    // The scenes that most methods fly.
    let flown = |scene: &str| {
        run.judged.iter().filter(|j| j.claim.scene.as_deref() == Some(scene) && evidence(j).is_some()).count()
    };
    scenes.sort_by_key(|scene| std::cmp::Reverse(flown(scene)));
    for scene in scenes.into_iter().take(3) {
        let mut marks = Vec::new();
        let mut keys = Vec::new();
        let mut all = Vec::new();
        let mut limits: Vec<f64> = Vec::new();
        for judged in run.judged.iter().filter(|j| j.claim.scene.as_deref() == Some(scene)) {
            let Some(points) = evidence(judged) else { continue };
            let method = judged.claim.method.map_or_else(String::new, |m| m.to_string());
            for (depth, residual) in &points {
                table.push([&scene, &method, depth, residual]);
            }
            let (ink, shape) = (Ink::series(keys.len()), Shape::series(keys.len()));
            let points: Vec<_> = points.into_iter().map(|(x, r)| (x * 1e3, r.abs().max(1e-17))).collect();
            all.extend(points.iter().copied());
            marks.push(Mark::Points { points, ink, shape, hollow: false, radius: RADIUS });
            keys.push(Key { text: method, ink, shape: Some(shape), hollow: false });
            limits.push(judged.claim.limit);
            behind.push(judged);
        }
        limits.sort_by(f64::total_cmp);
        limits.dedup();
        let x = Axis::linear("depth [mm]", all.iter().map(|p| p.0).chain([0.0]));
        let top = limits.iter().copied().fold(1e-12, f64::max);
        let y = Axis::log("|residual| / (M V₀²/2)", all.iter().map(|p| p.1).chain([1e-17, top * 2.0]));
        for limit in limits {
            marks.push(Mark::Line { points: x.range.map(|x| (x, limit)).to_vec(), ink: Ink::Muted, dashed: true });
            let at = (x.range[1], limit * 2.5);
            marks.push(Mark::Text { at, text: "limit".into(), ink: Ink::Muted, anchor: Anchor::End });
        }
        let worst = all.iter().map(|p| p.1).fold(0.0, f64::max);
        panels.push(Panel {
            title: format!("scene {scene}"),
            description: format!(
                "Energy residual over depth; the largest is {} of the initial energy.",
                number(worst, 2)
            ),
            x,
            y,
            marks,
            keys,
            key_place: KeyPlace::Head,
            height: HEIGHT,
        });
    }
    if panels.is_empty() {
        return None;
    }
    Some(Figure {
        name: "energy-residual".into(),
        part: Part::Energy,
        message: message(
            behind.iter().copied(),
            "The kinetic energy lost",
            "is the work done, all along the path",
            "is not the work done on every path",
        ),
        reading: "Each point is the end of a step: kinetic energy lost less the work of the force on the way, which is \
                  integrated apart from the method. Dashed: the limit of the claim. Residuals below 10⁻¹⁷ are drawn there."
            .to_owned(),
        claims: ids(run, behind),
        panels,
        table,
    })
}

/// Differences from other programs in units of the tolerance.
fn peers(run: &Run<'_>) -> Option<Figure> {
    let mut table =
        Table::new(["claim", "peer", "scene", "tolerance", "difference_over_tolerance", "limit", "verdict"]);
    let mut rows: Vec<(String, Vec<&Judged>)> = Vec::new();
    for judged in run.judged {
        let Check::Peer { name, tolerance } = &judged.claim.check else { continue };
        let Some(measured) = judged.measured else { continue };
        let scene = judged.claim.scene.as_deref().unwrap_or("");
        let verdict = judged.verdict.name();
        table.push([&judged.claim.id, name, &scene, tolerance, &measured, &judged.claim.limit, &verdict]);
        match rows.iter_mut().find(|(known, _)| known == name) {
            Some((_, members)) => members.push(judged),
            None => rows.push((name.clone(), vec![judged])),
        }
    }
    if rows.is_empty() {
        return None;
    }
    let behind: Vec<&Judged> = rows.iter().flat_map(|(_, members)| members.iter().copied()).collect();
    let shown = |j: &Judged| j.measured.unwrap_or(0.0).abs().max(1e-4);
    let x = Axis::log("largest difference / tolerance", behind.iter().map(|j| shown(j)).chain([1e-4, 20.0]));
    let mut marks = Vec::new();
    for (row, (name, members)) in rows.iter().enumerate() {
        let y = -(row as f64);
        let limit = members[0].claim.limit;
        let points = vec![(x.range[0], y - 0.42), (x.range[0], y - 0.02), (limit, y - 0.02), (limit, y - 0.42)];
        marks.push(Mark::Area { points, ink: Ink::Shade });
        marks.push(Mark::Text {
            at: (x.range[0], y + 0.24),
            text: label_of_peer(name, members),
            ink: Ink::Text,
            anchor: Anchor::Start,
        });
        for judged in members {
            let points = vec![(shown(judged), y - 0.22)];
            marks.push(Mark::Points {
                points,
                ink: ink_of(judged.verdict),
                shape: Shape::Circle,
                hollow: false,
                radius: RADIUS,
            });
        }
    }
    let bottom = -(rows.len() as f64) + 0.45;
    let panel = Panel {
        title: "differences by program".into(),
        description: format!(
            "Largest difference of {} from {}, over the tolerance.",
            count(behind.len(), "flight"),
            count(rows.len(), "program")
        ),
        x,
        y: Axis { label: String::new(), scale: Scale::Linear, range: [bottom, 0.55], numbered: false },
        marks,
        keys: Vec::new(),
        key_place: KeyPlace::Corner,
        height: (-40.0 * bottom) as i32 + 90,
    };
    Some(Figure {
        name: "peer-differences".into(),
        part: Part::CrossCode,
        message: message(
            behind.iter().copied(),
            "Other programs",
            "agree within their tolerance on every scene asked",
            "do not agree within their tolerance on every scene asked",
        ),
        reading:
            "Each dot is one scene: the largest difference of any quantity, divided by its conditioning and by the \
                  tolerance that is claimed. Shaded: within the limit. Differences below 10⁻⁴ are drawn there."
                .to_owned(),
        claims: ids(run, behind),
        panels: vec![panel],
        table,
    })
}

fn label_of_peer(name: &str, members: &[&Judged]) -> String {
    match &members[0].claim.check {
        Check::Peer { tolerance, .. } => format!("{name}, tolerance {}", number(*tolerance, 2)),
        _ => name.to_owned(),
    }
}

/// What is drawn over time: its name with its unit, the units in one of SI, and the number.
type Curve = (&'static str, f64, fn(&Sample) -> f64);

/// The panels of one flight and its way there; `None` for a flight without an end.
fn path_panels(name: &str, problem: &Problem, table: &mut Table) -> Option<(Vec<Panel>, Flight)> {
    let (samples, flight) = path_of(problem)?;
    for sample in &samples {
        let s = sample.state;
        table.push([&name, &s.time, &s.depth, &s.velocity, &sample.force, &sample.stage]);
    }
    let curves: [Curve; 3] = [
        ("depth [mm]", 1e3, |s| s.state.depth),
        ("velocity [m/s]", 1.0, |s| s.state.velocity),
        ("force [kN]", 1e-3, |s| s.force),
    ];
    let mut panels = Vec::new();
    for (label, unit, value) in curves {
        let points: Vec<_> = samples.iter().map(|s| (s.state.time * 1e3, value(s) * unit)).collect();
        let x = Axis::linear("time [ms]", points.iter().map(|p| p.0));
        let highest = points.iter().map(|p| p.1).fold(0.0, f64::max);
        // The names of many events stand one below the other.
        let rows = if flight.events.len() > 2 { 3 } else { 1 };
        let room = 1.0 + 0.12 * f64::from(rows);
        let y = Axis::linear(label, points.iter().map(|p| p.1).chain([0.0, highest * room]));
        let mut marks = Vec::new();
        for (index, event) in flight.events.iter().enumerate() {
            let time = event.state.time * 1e3;
            let points = y.range.map(|y| (time, y)).to_vec();
            marks.push(Mark::Line { points, ink: Ink::Muted, dashed: true });
            // The text stands where there is room: left of events in the right half.
            let right_half = time > 0.5 * (x.range[0] + x.range[1]);
            let anchor = if right_half { Anchor::End } else { Anchor::Start };
            let gap = 0.018 * (x.range[1] - x.range[0]) * if right_half { -1.0 } else { 1.0 };
            let row = (index % rows as usize) as f64;
            let at = (time + gap, y.range[1] - (0.035 + 0.085 * row) * (y.range[1] - y.range[0]));
            marks.push(Mark::Text { at, text: words_for_event(event.kind, problem), ink: Ink::Muted, anchor });
        }
        marks.push(Mark::Line { points, ink: Ink::Blue, dashed: false });
        panels.push(Panel {
            title: format!("{name}: {}", label.split(' ').next().unwrap_or(label)),
            description: format!(
                "{label} over time [ms]; the projectile {} at {} ms.",
                words_for_outcome(flight.outcome),
                number(flight.end.time * 1e3, 4)
            ),
            x,
            y,
            marks,
            keys: Vec::new(),
            key_place: KeyPlace::Corner,
            height: 230,
        });
    }
    Some((panels, flight))
}

const PATH_COLUMNS: [&str; 6] = ["scene", "time_s", "depth_m", "velocity_m_s", "force_n", "stage"];
const PATH_READING: &str = "Closed form, or the Taylor series where there is none. Dashed lines are events.";

/// Scenes of the claims with their problems.
fn problems(run: &Run<'_>) -> Vec<(String, Problem)> {
    scenes_in_order(run)
        .into_iter()
        .filter_map(|name| Some((name.clone(), run.suite.scenes.get(&name)?.problem().ok()?)))
        .collect()
}

/// Depth, velocity and force over time, events marked: one scene that stops in the tunnel and one that perforates.
fn paths(run: &Run<'_>) -> Option<Figure> {
    let mut table = Table::new(PATH_COLUMNS);
    let mut panels = Vec::new();
    let mut seen: Vec<bool> = Vec::new();
    let mut told = Vec::new();
    let mut problems = problems(run);
    // Scenes of a crater and one tunnel with drag first: they show all that the equation has. Layers have their own.
    problems
        .sort_by_key(|(_, problem)| (problem.stages.len() > 2, !problem.stages.iter().any(|stage| stage.drag > 0.0)));
    for (name, problem) in problems {
        // More than one stage on the way, and each kind of end once: that is what there is to see.
        let mut rows = table.clone();
        let Some((drawn, flight)) = path_panels(&name, &problem, &mut rows) else { continue };
        if flight.events.len() < 2 || seen.contains(&flight.outcome.is_stop()) || seen.len() == SCENES_MAX {
            continue;
        }
        seen.push(flight.outcome.is_stop());
        table = rows;
        panels.extend(drawn);
        told.push(format!("scene {name} {}", words_for_outcome(flight.outcome)));
    }
    if panels.is_empty() {
        return None;
    }
    Some(Figure {
        name: "flights".into(),
        part: Part::Model,
        message: format!("The force acts in stages: {}", told.join(", ")),
        reading: PATH_READING.to_owned(),
        claims: Vec::new(),
        panels,
        table,
    })
}

/// The same for the scene of most layers.
fn layers(run: &Run<'_>) -> Option<Figure> {
    let layers_of = |name: &str| Some(run.suite.scenes.get(name)?.concrete()?.layers.len());
    let mut problems = problems(run);
    // Stable: the first of those with most layers.
    problems.sort_by_key(|(name, _)| std::cmp::Reverse(layers_of(name)));
    let (name, problem) = problems.into_iter().next()?;
    let layers = layers_of(&name).filter(|layers| *layers > 0)?;
    let mut table = Table::new(PATH_COLUMNS);
    let (panels, flight) = path_panels(&name, &problem, &mut table)?;
    Some(Figure {
        name: format!("layers-{}", slug(&name)),
        part: Part::Layers,
        message: format!(
            "Through {} the force jumps at each boundary: scene {name} {}",
            count(layers, "layer"),
            words_for_outcome(flight.outcome)
        ),
        reading: PATH_READING.to_owned(),
        claims: Vec::new(),
        panels,
        table,
    })
}

/// Scenes in the order in which orders are asked of them, then the others.
pub fn scenes_in_order(run: &Run<'_>) -> Vec<String> {
    let mut names = scenes_by_variants(run, Quantity::Depth);
    let asked = run.judged.iter().filter(|j| matches!(j.claim.check, Check::Order { .. }));
    for judged in asked.chain(run.judged) {
        if let Some(scene) = &judged.claim.scene
            && !names.contains(scene)
        {
            names.push(scene.clone());
        }
    }
    names
}

fn words_for_outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::StoppedInCrater => "comes to rest in the crater",
        Outcome::StoppedInTunnel => "comes to rest in the tunnel",
        Outcome::Stopped => "comes to rest",
        Outcome::Perforated => "leaves the target",
        Outcome::Undecided => "ends within the error bar of leaving",
    }
}

fn words_for_event(kind: EventKind, problem: &Problem) -> String {
    match kind {
        EventKind::CraterEnd => "x = k d".to_owned(),
        EventKind::StageEnd(index) => format!("x = {} mm", number(problem.stages[index].end * 1e3, 3)),
        EventKind::Exit => "exit".to_owned(),
        EventKind::Rest => "rest".to_owned(),
    }
}
