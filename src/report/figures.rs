//! Which figures a run has: from the evidence of its claims, and the paths of its scenes.
//!
//! A figure appears where its evidence is; a suite of other scenes gets its own. Its message is what the verdicts of
//! the claims behind it allow, no more.

use std::f64::consts::FRAC_PI_4;
use std::fmt::Display;

use super::Run;
use super::chart::{Anchor, Axis, Ink, Panel, Point, Style};
use super::figure::Figure;
use super::text::{count, number};
use super::{stability_figures, sweep_figures};
use crate::integrators::closed_form::path;
use crate::integrators::{Boundaries, ClosedForm, Detail, Flight, Integrator, MethodName, Sample, Taylor, VelocityAt};
use crate::physics::semi_empirical::{depth_ratio, model_difference};
use crate::physics::{EventKind, Outcome, Problem};
use crate::studies::Quantity;
use crate::studies::order::{Exclusion, OrderFit};
use crate::suite::checks::{ApproachOrder, Order, Peer, StepPattern};
use crate::suite::{Check, Evidence, Judged, Verdict, grouped};

/// Scenes whose paths are shown at most, and scenes whose errors are.
const SCENES_MAX: usize = 2;

/// Height of the strips of one panel at most (px).
const STRIPS_MAX: f64 = 300.0;

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
    for figure in run.judged.iter().flat_map(|judged| of_evidence(run, judged)) {
        // The first claim with such evidence provides it.
        if !figures.iter().any(|known| known.name == figure.name) {
            figures.push(figure);
        }
    }
    figures.extend(stiffness(run));
    figures.extend(layers(run));
    figures
}

/// The figures that show the evidence of one claim.
fn of_evidence(run: &Run<'_>, judged: &Judged) -> Vec<Figure> {
    let drawn = match &judged.evidence {
        Some(Evidence::Boundary(points)) => vec![stability_figures::boundary(points, &[judged])],
        Some(Evidence::Rounding(rows)) => vec![stability_figures::rounding(rows, &[judged])],
        Some(Evidence::Sweep { plan, rows }) => {
            let measured = plan.beside(run.points, &Taylor::default()).unwrap_or_default();
            vec![
                sweep_figures::critical_energy(rows, run.points, &[judged]),
                sweep_figures::critical_energy_difference(rows, &measured, &[judged]),
            ]
        }
        Some(Evidence::Map { crater_ratio, lines, scenes }) => {
            vec![sweep_figures::applicability(*crater_ratio, lines, scenes, &[judged])]
        }
        Some(Evidence::Depths(comparisons)) => vec![sweep_figures::measured_depths(comparisons, &[judged])],
        Some(Evidence::Conclusion(_) | Evidence::Fit { .. } | Evidence::Series(_)) | None => Vec::new(),
    };
    drawn.into_iter().flatten().collect()
}

/// The fit behind a claim, with the order expected.
pub fn fit_of(judged: &Judged) -> Option<(f64, &OrderFit)> {
    match &judged.evidence {
        Some(Evidence::Fit { formal, fit }) => Some((*formal, fit)),
        _ => None,
    }
}

/// The claims whose check is one of `checks`, with their series.
fn series_of<'a>(run: &Run<'a>, checks: fn(&Check) -> bool) -> Vec<(&'a Judged, &'a [Point])> {
    let series = |judged: &'a Judged| match &judged.evidence {
        Some(Evidence::Series(points)) => Some((judged, points.as_slice())),
        _ => None,
    };
    run.judged.iter().filter(|judged| checks(&judged.claim.check)).filter_map(series).collect()
}

/// Colour and shape of a verdict.
fn style_of(verdict: Verdict) -> Style {
    let style = match verdict {
        Verdict::Passed => Style::marks(0),
        Verdict::Undecided => Style::marks(1),
        Verdict::Failed => Style::marks(2).ink(Ink::Red),
        Verdict::Skipped => Style::marks(3).ink(Ink::Muted).hollow(),
    };
    style.radius(2.0)
}

/// Adds the points of a fit, hollow where excluded. Errors of zero have no place on a logarithmic axis.
fn with_fit(panel: Panel, name: &str, fit: &OrderFit, style: Style) -> Panel {
    let chosen = |excluded| {
        fit.points.iter().filter(move |p| p.excluded == excluded).map(|p| (p.step, p.error.abs())).collect::<Vec<_>>()
    };
    let reasons = [
        (Exclusion::ZeroError, "zero error"),
        (Exclusion::RoundOffFloor, "round-off floor"),
        (Exclusion::PreAsymptotic, "pre-asymptotic"),
    ];
    let panel = reasons.into_iter().fold(panel, |panel, (reason, words)| {
        panel.unlisted(format!("{name}, excluded: {words}"), style.hollow(), chosen(Some(reason)))
    });
    panel.series(name, style, chosen(None))
}

/// `0.98`, or a dash where nothing was fitted.
fn slope_of(fit: &OrderFit, digits: usize) -> String {
    fit.line.map_or_else(|| "—".to_owned(), |line| format!("{:.digits$}", line.order))
}

/// The order claims of `scene` and `quantity` with equal steps, and their fits.
fn variants<'a>(run: &Run<'a>, scene: &str, quantity: Quantity) -> Vec<(&'a Judged, f64, &'a OrderFit)> {
    let of_scene = run.judged.iter().filter(|j| {
        matches!(j.claim.check, Check::Order(Order { steps: StepPattern::Uniform, .. }))
            && j.claim.scene.as_deref() == Some(scene)
            && j.claim.quantity == Some(quantity)
    });
    of_scene.filter_map(|judged| fit_of(judged).map(|(formal, fit)| (judged, formal, fit))).collect()
}

/// Scenes in which `quantity` has more than one formal order, most variants of the scheme first.
fn scenes_by_variants(run: &Run<'_>, quantity: Quantity) -> Vec<String> {
    let scenes = grouped(run.judged.iter().filter_map(|j| j.claim.scene.as_deref()), |scene| *scene);
    let mut found: Vec<_> = scenes.into_iter().map(|(scene, _)| (scene, variants(run, scene, quantity))).collect();
    found.retain(|(_, variants)| variants.iter().any(|variant| variant.1 != variants[0].1));
    // Stable: among equals the suite's order stays.
    found.sort_by_key(|(_, variants)| std::cmp::Reverse(variants.len()));
    found.into_iter().map(|(scene, _)| scene.to_owned()).collect()
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

/// Whether the points of two fits lie on each other in a drawing: nineteen of twenty by less than a tenth of a factor.
fn coincide(one: &OrderFit, other: &OrderFit) -> bool {
    let pairs: Vec<_> = one.points.iter().zip(&other.points).filter(|(a, b)| a.step == b.step).collect();
    let near = pairs.iter().filter(|(a, b)| (a.error.abs() / b.error.abs()).ln().abs() < 0.1).count();
    pairs.len() == one.points.len().max(other.points.len()) && near * 20 >= pairs.len() * 19
}

/// Error against the step for every variant of the scheme, one panel a velocity rule.
fn errors_over_step(run: &Run<'_>, scene: &str, quantity: Quantity) -> Option<Figure> {
    let fits = variants(run, scene, quantity);
    let points = || fits.iter().flat_map(|(.., fit)| &fit.points);
    let coarsest = points().map(|p| p.step).fold(0.0, f64::max);
    let finest = points().map(|p| p.step).fold(f64::INFINITY, f64::min);
    let mut errors: Vec<f64> = points().map(|p| p.error.abs()).filter(|e| *e > 0.0).collect();
    errors.sort_by(f64::total_cmp);
    let largest = *errors.last()?;
    // Single errors close to a change of sign lie decades below the others. They are drawn at the lower edge.
    let low = errors[errors.len() / 50].min(0.03 * f64::EPSILON * coarsest / finest);
    // The estimate of the round-off: `eps` times the number of steps.
    let round_off =
        [(finest, low), (finest, f64::EPSILON * coarsest / finest), (coarsest, f64::EPSILON), (coarsest, low)];
    let panel = |velocity: VelocityAt| {
        let y = Axis::log("relative error", "").over([low, largest * 6.0]);
        let mut panel = Panel::new(format!("{velocity} velocity in the drag"), Axis::log("step", "s"), y)
            .series("round-off", Style::area(Ink::Shade), round_off)
            .slope("slope 1", 1.0, (coarsest, largest * 3.0))
            .slope("slope 2", 2.0, (coarsest, largest * 3.0));
        let mut drawn: Vec<(Boundaries, &OrderFit)> = Vec::new();
        for (index, boundaries) in Boundaries::ALL.into_iter().enumerate() {
            let is_this = |j: &Judged| j.claim.rules() == (velocity, boundaries);
            let Some(&(.., fit)) = fits.iter().find(|(j, ..)| is_this(j)) else { continue };
            let style = Style::nested(index);
            let same = drawn.iter().find(|(_, other)| coincide(other, fit));
            let same = same.map_or_else(String::new, |(other, _)| format!(", as {other}"));
            panel = with_fit(panel, &format!("{boundaries}: {}{same}", slope_of(fit, 2)), fit, style);
            drawn.push((boundaries, fit));
        }
        panel
    };
    let judged: Vec<_> = fits.iter().map(|(judged, ..)| *judged).collect();
    let kind = format!("error-{}", quantity.name().replace('_', "-"));
    Some(Figure::new(&kind, scene, &judged, &[&scene], VelocityAt::ALL.map(panel).into())?.sharing_axes())
}

/// A labelled strip of claims: what is allowed, the target if there is one, and a dot with its interval for each claim.
struct Strip<'a> {
    label: String,
    allowed: [f64; 2],
    target: Option<f64>,
    dots: Vec<(f64, [f64; 2], &'a Judged)>,
}

impl Strip<'_> {
    /// Height of its label (px).
    const LABEL: f64 = 16.0;
    /// Space below it (px).
    const GAP: f64 = 6.0;

    /// Height of its dots (px).
    fn height_of_dots(&self) -> f64 {
        4.0 * self.dots.len().max(2) as f64
    }

    /// Height with its label and the space below it (px).
    fn height(&self) -> f64 {
        Self::LABEL + self.height_of_dots() + Self::GAP
    }
}

/// Strips one below the other, each dot on a line of its own.
fn strips<'a>(title: impl Into<String>, x: Axis, strips: impl Iterator<Item = &'a Strip<'a>> + Clone) -> Panel {
    let total: f64 = strips.clone().map(Strip::height).sum();
    let mut panel = Panel::new(title, x, Axis::linear("", "").over([-total, 0.0])).tall(total);
    let mut top = 0.0;
    for strip @ Strip { label, allowed: [low, high], target, dots } in strips {
        let bottom = top - Strip::LABEL - strip.height_of_dots();
        panel = panel.label((f64::NEG_INFINITY, top - 0.5 * Strip::LABEL), label, Anchor::Start);
        top -= Strip::LABEL;
        let corners = [(*low, top), (*low, bottom), (*high, bottom), (*high, top)];
        panel = panel.unlisted(format!("{label}: allowed"), Style::area(Ink::Shade), corners);
        for (index, (at, [low, high], judged)) in dots.iter().enumerate() {
            let y = top - (top - bottom) * (index as f64 + 0.5) / dots.len() as f64;
            let style = style_of(judged.verdict);
            panel = panel.unlisted(&judged.claim.id, style.as_line(), [(*low, y), (*high, y)]).series(
                judged.verdict.name(),
                style,
                [(*at, y)],
            );
        }
        // Through label and gap too: among dots that lie on it, it is not seen.
        let expected = target.iter().flat_map(|x| [(*x, bottom - Strip::GAP), (*x, top + Strip::LABEL)]);
        panel = panel.unlisted(format!("{label}: expected"), Style::REFERENCE, expected);
        top = bottom - Strip::GAP;
    }
    panel
}

/// Observed order with its interval beside the formal order, one strip a table of claims.
fn observed_orders(run: &Run<'_>) -> Option<Figure> {
    let is_order =
        |j: &&Judged| matches!(j.claim.check, Check::Order(_) | Check::Manufactured(_) | Check::ApproachOrder(_));
    let fitted = |judged| fit_of(judged).and_then(|(formal, fit)| Some((formal, judged, fit.line?)));
    let mut all: Vec<_> = run.judged.iter().filter(is_order).filter_map(fitted).collect();
    // Stable: within an order the suite's order stays.
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut panels = Vec::new();
    for (formal, members) in grouped(&all, |(formal, ..)| *formal) {
        let mut reach = 0.3_f64;
        let mut rows = Vec::new();
        for (id, members) in grouped(members, |(_, judged, _)| judged.claim.table.as_str()) {
            let limit = members[0].1.claim.limit.min(1.0);
            reach = members.iter().map(|m| (m.2.order - formal).abs().min(1.0)).fold(reach.max(limit), f64::max);
            rows.push(Strip {
                label: format!("{id} ({})", members.len()),
                allowed: [formal - limit, formal + limit],
                target: Some(formal),
                dots: members.iter().map(|(_, judged, line)| (line.order, line.interval95, *judged)).collect(),
            });
        }
        // What leaves the panel ends at its edge.
        let x = || Axis::linear("observed order", "").over([formal - reach * 1.05, formal + reach * 1.05]);
        // Strips of many claims are shared out to panels that a screen holds.
        let parts = rows.iter().map(Strip::height).sum::<f64>().div_euclid(STRIPS_MAX) as usize + 1;
        let share = rows.iter().map(Strip::height).sum::<f64>() / parts as f64;
        let mut height = 0.0;
        let placed: Vec<(usize, Strip<'_>)> = rows
            .into_iter()
            .map(|strip| {
                let middle = height + 0.5 * strip.height();
                height += strip.height();
                (((middle / share) as usize).min(parts - 1), strip)
            })
            .collect();
        for part in placed.chunk_by(|a, b| a.0 == b.0) {
            let title = if parts == 1 { String::new() } else { format!(", part {} of {parts}", part[0].0 + 1) };
            let strips_of_part = part.iter().map(|(_, strip)| strip);
            panels.push(strips(format!("formal order {formal}{title}"), x(), strips_of_part));
        }
    }
    let judged: Vec<_> = all.iter().map(|(_, judged, _)| *judged).collect();
    Figure::new("observed-orders", "", &judged, &[], panels)
}

/// Error against tolerance, one panel a method.
fn tolerances(run: &Run<'_>) -> Option<Figure> {
    let proportionality = run.judged.iter().filter(|j| matches!(j.claim.check, Check::Proportionality(_)));
    let fits: Vec<_> = proportionality.filter_map(|j| Some((j.claim.method?, j, fit_of(j)?.1))).collect();
    let limit = fits.iter().map(|(_, j, _)| j.claim.limit).fold(0.0, f64::max);
    let panel = |(method, members): (MethodName, Vec<&(_, &Judged, &OrderFit)>)| {
        let tolerances = members.iter().flat_map(|(.., fit)| fit.points.iter().map(|p| p.step));
        let errors = Axis::log("relative error", "").including(tolerances);
        let panel = Panel::new(method.to_string(), Axis::log("tolerance", ""), errors);
        let panel = panel.slope("error = tolerance", 1.0, (1.0, 1.0));
        members.into_iter().enumerate().fold(panel, |panel, (index, (_, judged, fit))| {
            let quantity = judged.claim.quantity.map_or("", Quantity::name);
            let name = format!("{quantity}: slope {}", slope_of(fit, 2));
            with_fit(panel, &name, fit, Style::marks(index))
        })
    };
    let panels = grouped(&fits, |(method, ..)| *method).into_iter().map(panel).collect();
    let judged: Vec<_> = fits.iter().map(|(_, judged, _)| *judged).collect();
    Some(Figure::new("tolerance-proportionality", "", &judged, &[&number(limit, 2)], panels)?.sharing_axes())
}

/// The approach to Eq. 11-12 with 1/N, with its predicted constant.
fn approach(run: &Run<'_>) -> Option<Figure> {
    let mut panels = Vec::new();
    let mut behind = Vec::new();
    for judged in run.judged {
        let (Check::ApproachOrder(ApproachOrder { impact }), Some((_, fit))) = (&judged.claim.check, fit_of(judged))
        else {
            continue;
        };
        // These claims have k = 2.
        let constant = model_difference(*impact, 1.0, 2.0) * depth_ratio(*impact, 2.0);
        let equation = if *impact <= 2.0 * FRAC_PI_4 { 11 } else { 12 };
        let title = format!("to Eq. {equation} at I = {impact}");
        let predicted = fit.points.iter().map(|p| (p.step, constant.abs() * p.step));
        let panel = Panel::new(title, Axis::log("1/N", ""), Axis::log("|difference| of X/d", "")).series(
            format!("predicted: {} / N", number(constant, 4)),
            Style::line(0).ink(Ink::Orange),
            predicted,
        );
        panels.push(with_fit(panel, &format!("solved: order {}", slope_of(fit, 4)), fit, Style::marks(0)));
        behind.push(judged);
    }
    behind.extend(run.judged.iter().filter(|j| matches!(j.claim.check, Check::ApproachConstant(_))));
    Figure::new("approach-with-n", "", &behind, &[], panels)
}

/// Residual of the energy balance along the path.
fn energy(run: &Run<'_>) -> Option<Figure> {
    /// Smaller residuals are drawn there.
    const LEAST: f64 = 1e-17;
    let all = series_of(run, |check| matches!(check, Check::EnergyBalance(_)));
    let mut scenes = grouped(&all, |(j, _)| j.claim.scene.as_deref().unwrap_or(""));
    // The scenes with most methods.
    scenes.sort_by_key(|(_, members)| std::cmp::Reverse(members.len()));
    scenes.truncate(3);
    let behind: Vec<&Judged> =
        scenes.iter().flat_map(|(_, members)| members.iter().map(|(judged, _)| *judged)).collect();
    let panel = |(scene, members): (&str, Vec<&(&Judged, &[Point])>)| {
        let limits = grouped(&members, |(judged, _)| judged.claim.limit);
        // Room for the name of the highest limit above its line.
        let values = limits.iter().map(|(limit, _)| 10.0 * limit);
        let residuals = Axis::log("|residual| / (M V₀²/2)", "").from(LEAST).including(values.chain([0.0]));
        let panel = Panel::new(format!("scene {scene}"), Axis::linear("depth", "mm").including([0.0]), residuals);
        let panel = limits.into_iter().fold(panel, |panel, (limit, members)| {
            let methods = grouped(members, |(judged, _)| judged.claim.method.unwrap_or_default().name());
            let methods: Vec<_> = methods.into_iter().map(|(name, _)| name).collect();
            panel.slope(format!("limit, {}", methods.join(", ")), 0.0, (0.0, limit))
        });
        members.into_iter().enumerate().fold(panel, |panel, (index, (judged, points))| {
            let points = points.iter().map(|(x, r)| (x * 1e3, r.abs()));
            panel.series(judged.claim.method.unwrap_or_default().name(), Style::marks(index), points)
        })
    };
    Figure::new("energy-residual", "", &behind, &[], scenes.into_iter().map(panel).collect())
}

/// Cost over r/M by method: a stage that resists, and one that is driven.
fn stiffness(run: &Run<'_>) -> Option<Figure> {
    let resisting = series_of(run, |check| matches!(check, Check::ViscousResisting(_)));
    let driven = series_of(run, |check| matches!(check, Check::ViscousDriven(_)));
    let is_explicit = |method| matches!(method, MethodName::Taylor | MethodName::Tsit45);
    let has_implicit = driven.iter().any(|(judged, _)| !judged.claim.method.is_some_and(is_explicit));
    let panel = |title, members: &[(&Judged, &[Point])]| {
        let panel = Panel::new(title, Axis::log("r/M", "1/s"), Axis::log("force evaluations", ""));
        members.iter().fold(panel, |panel, (judged, points)| {
            let method = judged.claim.method.unwrap_or_default();
            // One colour a method, in both panels. What chooses among others lies on one of them, around its marks.
            let style = Style::marked_line(method as usize);
            let style = if method == MethodName::Adaptive { style.hollow().radius(5.0) } else { style };
            panel.series(method.name(), style, points.iter().copied())
        })
    };
    let panels = vec![panel("a stage that resists", &resisting), panel("a driven stage", &driven)];
    let judged: Vec<_> = resisting.iter().chain(&driven).map(|(judged, _)| *judged).collect();
    let implicit = if has_implicit { ", and no more by implicit ones" } else { "" };
    Some(Figure::new("stiffness", "", &judged, &[&implicit], panels)?.sharing_axes())
}

/// Differences from other programs in units of the tolerance.
fn peers<'a>(run: &Run<'a>) -> Option<Figure> {
    /// Smaller differences are drawn there.
    const LEAST: f64 = 1e-4;
    let of_peer = |judged: &'a Judged| match (&judged.claim.check, judged.measured) {
        (Check::Peer(peer), Some(measured)) => Some((peer, measured.abs(), judged)),
        _ => None,
    };
    let all: Vec<(&Peer, f64, &Judged)> = run.judged.iter().filter_map(of_peer).collect();
    let strips_of_peers = grouped(&all, |(peer, ..)| &peer.name).into_iter().map(|(name, members)| Strip {
        label: format!("{name}, tolerance {}", number(members[0].0.tolerance, 2)),
        allowed: [0.5 * LEAST, members[0].2.claim.limit],
        target: None,
        dots: members.iter().map(|(_, shown, judged)| (*shown, [*shown; 2], *judged)).collect(),
    });
    let rows: Vec<_> = strips_of_peers.collect();
    let x = Axis::log("largest difference / tolerance", "").from(LEAST).including([LEAST, 20.0]);
    let judged: Vec<&Judged> = all.iter().map(|(.., judged)| *judged).collect();
    Figure::new("peer-differences", "", &judged, &[], vec![strips("differences by program", x, rows.iter())])
}

/// The path of `problem` from impact to its end, dense enough to be drawn, and its solution with the events.
///
/// From the closed form; where there is none, every step of the Taylor series. `None` where neither has a solution. The
/// parts become shorter towards an event: near rest little depth takes long.
fn path_of(problem: &Problem) -> Option<(Vec<Sample>, Flight)> {
    /// Parts of the path between two events.
    const INTERVALS: u32 = 60;
    if let Ok(flight) = ClosedForm.solve(problem, Detail::Events) {
        let towards_the_end = |share: f64| 1.0 - (1.0 - share) * (1.0 - share);
        return Some((path(problem, &flight, INTERVALS, towards_the_end).ok()?, flight));
    }
    let mut flight = Taylor::default().solve(problem, Detail::Trajectory).ok()?;
    Some((std::mem::take(&mut flight.trajectory), flight))
}

/// What is drawn over time: its name, its unit, and the number in it.
type Curve = (&'static str, &'static str, fn(&Sample) -> f64);

/// The panels of the solution of `problem`, and the solution; `None` if it has no end.
fn path_panels(name: &str, problem: &Problem) -> Option<(Vec<Panel>, Flight)> {
    let (samples, flight) = path_of(problem)?;
    let curves: [Curve; 3] = [
        ("depth", "mm", |s| s.state.depth * 1e3),
        ("velocity", "m/s", |s| s.state.velocity),
        ("force", "kN", |s| s.force * 1e-3),
    ];
    let panel = |(title, unit, value): Curve| {
        let y = Axis::linear(title, unit).including([0.0]);
        let panel = Panel::new(format!("{name}: {title}"), Axis::linear("time", "ms"), y).tall(148.0).unlisted(
            title,
            Style::line(0),
            samples.iter().map(|s| (s.state.time * 1e3, value(s))),
        );
        flight
            .events
            .iter()
            .fold(panel, |panel, event| panel.upright(words_for_event(event.kind, problem), event.state.time * 1e3))
    };
    Some((curves.into_iter().map(panel).collect(), flight))
}

/// Scenes of the claims with their problems.
fn problems<'a>(run: &Run<'a>) -> Vec<(String, &'a Problem)> {
    let names = scenes_in_order(run).into_iter();
    names.filter_map(|name| run.suite.scenes.problem(&name).ok().map(|problem| (name, problem))).collect()
}

/// Depth, velocity and force over time, events marked: one scene that stops in the tunnel and one that perforates.
fn paths(run: &Run<'_>) -> Option<Figure> {
    let mut panels = Vec::new();
    let mut ends: Vec<(bool, String)> = Vec::new();
    let mut problems = problems(run);
    // Scenes of a crater and one tunnel with drag first: they show all that the equation has. Layers have their own.
    problems
        .sort_by_key(|(_, problem)| (problem.stages.len() > 2, !problem.stages.iter().any(|stage| stage.drag > 0.0)));
    for (name, problem) in problems {
        // Scenes with an event before the end, and each kind of end once.
        let Some((drawn, flight)) = path_panels(&name, problem) else { continue };
        let stops = flight.outcome.is_stop();
        if flight.events.len() > 1 && ends.iter().all(|(known, _)| *known != stops) {
            panels.extend(drawn);
            ends.push((stops, format!("scene {name} {}", words_for_outcome(flight.outcome))));
        }
    }
    let ends: Vec<_> = ends.into_iter().map(|(_, words)| words).collect();
    Figure::new("flights", "", &[], &[&ends.join(", ")], panels)
}

/// The same for the scene of most layers.
fn layers(run: &Run<'_>) -> Option<Figure> {
    let layers_of = |name: &str| Some(run.suite.scenes.get(name)?.concrete()?.layers.len());
    let mut problems = problems(run);
    // Stable: the first of those with most layers.
    problems.sort_by_key(|(name, _)| std::cmp::Reverse(layers_of(name)));
    let (name, problem) = problems.into_iter().next()?;
    let layers = layers_of(&name).filter(|layers| *layers > 0)?;
    let (panels, flight) = path_panels(&name, problem)?;
    let words = [&count(layers, "layer") as &dyn Display, &name, &words_for_outcome(flight.outcome)];
    Figure::new("layers", &name, &[], &words, panels)
}

/// Scenes in the order in which orders are asked of them, then the others.
pub fn scenes_in_order(run: &Run<'_>) -> Vec<String> {
    let mut names = scenes_by_variants(run, Quantity::Depth);
    let asked = run.judged.iter().filter(|j| matches!(j.claim.check, Check::Order(_)));
    for scene in asked.chain(run.judged).filter_map(|judged| judged.claim.scene.as_ref()) {
        if !names.contains(scene) {
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
        Outcome::Undecided => "ends within the error bound of leaving",
    }
}

fn words_for_event(kind: EventKind, problem: &Problem) -> String {
    match kind {
        EventKind::CraterEnd => "x = k d".to_owned(),
        EventKind::StageEnd(index) if problem.stages[index].end == f64::INFINITY => format!("the end of stage {index}"),
        EventKind::StageEnd(index) => format!("x = {} mm", number(problem.stages[index].end * 1e3, 3)),
        EventKind::Plug | EventKind::Exit | EventKind::Rest => kind.name().to_owned(),
    }
}
