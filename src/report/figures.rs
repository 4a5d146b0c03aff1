//! Which figures a run has: from the evidence of its claims, and the paths of its scenes.
//!
//! A figure appears where its evidence is; a suite of other scenes gets its own. Its message is what the verdicts of
//! the claims behind it allow, no more.

use std::f64::consts::FRAC_PI_4;

use super::Run;
use super::chart::{Anchor, Axis, Ink, Panel, Point, Style};
use super::figure::{Figure, grouped};
use super::figure_data::path_of;
use super::table::{Table, or_empty};
use super::text::{count, number};
use super::{stability_figures, sweep_figures};
use crate::integrators::{Flight, Sample};
use crate::physics::semi_empirical::{depth_ratio, model_difference};
use crate::physics::{EventKind, Outcome, Problem};
use crate::studies::Quantity;
use crate::studies::bench::step_size::{BOUNDARIES, VELOCITIES};
use crate::studies::order::{Exclusion, OrderFit};
use crate::suite::checks::{ApproachOrder, Order, Peer, StepPattern};
use crate::suite::{Check, Evidence, Judged, Section, Verdict, tables};

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

/// Figures that show the evidence of one claim. The first claim with such evidence provides it.
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
                vec![sweep_figures::applicability(*crater_ratio, lines, scenes)]
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

/// Adds the points of a fit, hollow where excluded. Errors of zero have no place on a logarithmic axis.
fn with_fit(panel: Panel, name: String, fit: &OrderFit, style: Style) -> Panel {
    let chosen = |used| fit.points.iter().filter(move |p| p.used == used).map(|p| (p.step, p.error.abs()));
    panel.series("", style.hollow(), chosen(false)).series(name, style, chosen(true))
}

/// `0.98`, or a dash where nothing was fitted.
fn slope_of(fit: &OrderFit) -> String {
    fit.line.map_or_else(|| "—".to_owned(), |line| format!("{:.2}", line.order))
}

/// The order claims of `scene` and `quantity` with equal steps.
fn variants<'a>(run: &Run<'a>, scene: &str, quantity: Quantity) -> Vec<&'a Judged> {
    run.judged
        .iter()
        .filter(|j| {
            matches!(j.claim.check, Check::Order(Order { steps: StepPattern::Uniform, .. }))
                && j.claim.scene.as_deref() == Some(scene)
                && j.claim.quantity == Some(quantity)
                && fit_of(j).is_some()
        })
        .collect()
}

/// Scenes in which `quantity` has more than one formal order, most variants of the scheme first.
fn scenes_by_variants(run: &Run<'_>, quantity: Quantity) -> Vec<String> {
    let scenes = grouped(run.judged.iter().filter_map(|j| j.claim.scene.as_deref()), |scene| *scene);
    let formal = |j: &Judged| fit_of(j).map(|(_, formal, _)| formal);
    let mut found: Vec<_> = scenes.into_iter().map(|(scene, _)| (scene, variants(run, scene, quantity))).collect();
    found.retain(|(_, variants)| variants.iter().any(|j| formal(j) != formal(variants[0])));
    // Stable: among equals the suite's order stays.
    found.sort_by_key(|(_, variants)| std::cmp::Reverse(variants.len()));
    found.into_iter().map(|(scene, _)| scene.to_owned()).collect()
}

/// Names of the tables of the suite that hold `judged`.
fn ids<'a>(run: &Run<'_>, judged: impl IntoIterator<Item = &'a Judged>) -> Vec<String> {
    let wanted: Vec<&str> = judged.into_iter().map(|j| j.claim.table.as_str()).collect();
    let names = tables(run.judged).map(|claims| claims[0].claim.table.as_str());
    names.filter(|name| wanted.contains(name)).map(str::to_owned).collect()
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
    let mut errors: Vec<f64> = points().map(|p| p.error.abs()).filter(|e| *e > 0.0).collect();
    errors.sort_by(f64::total_cmp);
    let largest = *errors.last()?;
    // Single errors close to a change of sign lie decades below the others. They are drawn at the lower edge.
    let low = errors[errors.len() / 50].min(0.03 * f64::EPSILON * coarsest / finest);
    let mut table = Table::new(
        "velocity_rule,boundary_rule,dt_s,relative_error,used,excluded,formal_order,observed_order,low95,high95",
    );
    let mut panels = Vec::new();
    for velocity in VELOCITIES {
        let mut panel = Panel::new(
            format!("{velocity} velocity in the drag"),
            Axis::log("step", "s"),
            Axis::log("relative error", "").over([low, largest * 6.0]),
        )
        .described(format!("Error of the {}. Numbers are observed orders.", words_for(quantity)))
        // The estimate of the round-off: `eps` times the number of steps.
        .floor("round-off", -1.0, (coarsest, f64::EPSILON))
        .slope("slope 1", 1.0, (coarsest, largest * 3.0))
        .slope("slope 2", 2.0, (coarsest, largest * 3.0));
        for (index, boundaries) in BOUNDARIES.into_iter().enumerate() {
            let is_this = |j: &Judged| j.claim.velocity == velocity && j.claim.boundaries == boundaries;
            let Some((_, formal, fit)) = fits.iter().find(|(j, ..)| is_this(j)) else { continue };
            // Smaller from series to series, so that one shows behind another where they coincide.
            let style = Style::marks(index).radius([4.0, 3.25, 2.0][index]);
            panel = with_fit(panel, format!("{boundaries}: {}", slope_of(fit)), fit, style);
            for point in &fit.points {
                table.push([
                    &velocity,
                    &boundaries,
                    &point.step,
                    &point.error,
                    &point.used,
                    &reason_of(point.excluded),
                    formal,
                    &or_empty(fit.line.map(|l| l.order)),
                    &or_empty(fit.line.map(|l| l.interval95[0])),
                    &or_empty(fit.line.map(|l| l.interval95[1])),
                ]);
            }
        }
        panels.push(panel);
    }
    panels.retain(|panel| !panel.is_empty());
    let figure = Figure::new(
        format!("error-{}-{}", quantity.name().replace('_', "-"), slug(scene)),
        if matches!(quantity, Quantity::CraterEndTime) { Section::Events } else { Section::Orders },
        message(
            judged.iter().copied(),
            &format!("Scene {scene}: the error of the {}", words_for(quantity)),
            "falls with the formal order of each variant",
            "is not shown to fall with the formal order of every variant",
        ),
        "Each point is one solution; step sizes have random ratios. Numbers beside the names are observed orders. \
         Hollow points are outside the fit. The shaded corner is the round-off of the number of steps.",
        panels,
        table,
    )?;
    Some(figure.judged_by(ids(run, judged)).sharing_axes())
}

/// Letters, digits and hyphens of a name.
fn slug(name: &str) -> String {
    let stem = name.rsplit('/').next().unwrap_or(name).trim_end_matches(".toml");
    stem.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).take(60).collect()
}

/// A labelled strip of claims: what is allowed, the target if there is one, and a dot with its interval for each claim.
struct Strip<'a> {
    label: String,
    allowed: [f64; 2],
    target: Option<f64>,
    dots: Vec<(f64, [f64; 2], &'a Judged)>,
}

/// Strips one below the other, each dot on a line of its own.
fn strips(title: impl Into<String>, x: Axis, strips: &[Strip<'_>]) -> Panel {
    // Heights [px]: of a label, of a dot, between strips.
    const LABEL: f64 = 16.0;
    const LINE: f64 = 4.0;
    const GAP: f64 = 6.0;
    let height_of = |strip: &Strip<'_>| LINE * strip.dots.len().max(2) as f64;
    let total: f64 = strips.iter().map(|strip| LABEL + height_of(strip) + GAP).sum();
    let mut panel = Panel::new(title, x, Axis::linear("", "").over([-total, 0.0])).tall(total);
    let mut top = 0.0;
    for strip in strips {
        let height = height_of(strip);
        panel = panel.label((f64::NEG_INFINITY, top - 0.5 * LABEL), &strip.label, Anchor::Start);
        top -= LABEL;
        panel = panel.rectangle("", Ink::Shade, strip.allowed, [top - height, top]);
        panel =
            panel.series("", Style::REFERENCE, strip.target.into_iter().flat_map(|x| [(x, top - height), (x, top)]));
        for (index, (at, [low, high], judged)) in strip.dots.iter().enumerate() {
            let y = top - height * (index as f64 + 0.5) / strip.dots.len() as f64;
            let style = style_of(judged.verdict);
            panel = panel.series("", style.as_line(), [(*low, y), (*high, y)]);
            panel = panel.series(judged.verdict.name(), style, [(*at, y)]);
        }
        top -= height + GAP;
    }
    panel
}

/// Observed order with its interval beside the formal order, one strip a table of claims.
fn observed_orders(run: &Run<'_>) -> Option<Figure> {
    let is_order =
        |j: &Judged| matches!(j.claim.check, Check::Order(_) | Check::Manufactured(_) | Check::ApproachOrder(_));
    let mut table = Table::new("claim,formal_order,observed_order,low95,high95,limit,points_used,points,verdict");
    let mut all: Vec<_> = run
        .judged
        .iter()
        .filter(|judged| is_order(judged))
        .filter_map(|judged| fit_of(judged).and_then(|(_, formal, fit)| Some((formal, judged, fit.line?, fit))))
        .collect();
    // Stable: within an order the suite's order stays.
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut panels = Vec::new();
    for (formal, members) in grouped(&all, |(formal, ..)| *formal) {
        let mut reach = 0.3_f64;
        let mut rows = Vec::new();
        for (id, members) in grouped(members, |(_, judged, ..)| judged.claim.table.as_str()) {
            let limit = members[0].1.claim.limit.min(1.0);
            reach = members.iter().map(|m| (m.2.order - formal).abs().min(1.0)).fold(reach.max(limit), f64::max);
            rows.push(Strip {
                label: format!("{id} ({})", members.len()),
                allowed: [formal - limit, formal + limit],
                target: Some(formal),
                dots: members.iter().map(|(_, judged, line, _)| (line.order, line.interval95, *judged)).collect(),
            });
            for (_, judged, line, fit) in members {
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
        }
        // What leaves the panel ends at its edge.
        let x = Axis::linear("observed order", "").over([formal - reach * 1.05, formal + reach * 1.05]);
        panels.push(strips(format!("formal order {formal}"), x, &rows));
    }
    let judged: Vec<_> = all.iter().map(|(_, judged, ..)| *judged).collect();
    let figure = Figure::new(
        "observed-orders",
        Section::Orders,
        message(
            judged.iter().copied(),
            "Observed orders",
            "are the formal ones, degraded orders included",
            "are not all shown to be the formal ones",
        ),
        "Each dot is one claim: the order of a least-squares fit, with its 95 % interval. The dashed line is the formal \
         order, the shaded band the limit of the claim. What lies beyond the panel is drawn at its edge.",
        panels,
        table,
    )?;
    Some(figure.judged_by(ids(run, judged)))
}

/// Error against tolerance, one panel a method.
fn tolerances(run: &Run<'_>) -> Option<Figure> {
    let proportionality = run.judged.iter().filter(|j| matches!(j.claim.check, Check::Proportionality(_)));
    let fits: Vec<_> = proportionality.filter_map(|j| Some((j.claim.method?, j, fit_of(j)?.2))).collect();
    let limit = fits.iter().map(|(_, j, _)| j.claim.limit).fold(0.0, f64::max);
    let mut table = Table::new("method,scene,quantity,rtol,relative_error,used,excluded,slope");
    let mut panels = Vec::new();
    for (method, members) in grouped(&fits, |(method, ..)| *method) {
        let tolerances = members.iter().flat_map(|(.., fit)| fit.points.iter().map(|p| p.step));
        let errors = Axis::log("relative error", "").including(tolerances);
        let mut panel = Panel::new(method.to_string(), Axis::log("tolerance", ""), errors).slope(
            "error = tolerance",
            1.0,
            (1.0, 1.0),
        );
        for (index, (_, judged, fit)) in members.into_iter().enumerate() {
            let name = judged.claim.quantity.map_or("", Quantity::name);
            panel = with_fit(panel, format!("{name}: slope {}", slope_of(fit)), fit, Style::marks(index));
            for point in &fit.points {
                table.push([
                    &method,
                    &judged.claim.scene.as_deref().unwrap_or(""),
                    &name,
                    &point.step,
                    &point.error,
                    &point.used,
                    &reason_of(point.excluded),
                    &or_empty(fit.line.map(|line| line.order)),
                ]);
            }
        }
        panels.push(panel);
    }
    let judged: Vec<_> = fits.iter().map(|(_, judged, _)| *judged).collect();
    let figure = Figure::new(
        "tolerance-proportionality",
        Section::Orders,
        message(
            judged.iter().copied(),
            "Errors",
            &format!("fall with the tolerance, with slopes within {} of 1", number(limit, 2)),
            "are not all shown to fall with the tolerance as they should",
        ),
        "Each point is one solution. A method that meets its tolerance stays near the dashed line; a slope of 1 is \
         proportional. Hollow points are outside the fit.",
        panels,
        table,
    )?;
    Some(figure.judged_by(ids(run, judged)).sharing_axes())
}

/// The approach to Eq. 11-12 with 1/N, with its predicted constant.
fn approach(run: &Run<'_>) -> Option<Figure> {
    let mut table = Table::new("claim,impact_function,one_over_n,difference_x_over_d,predicted_x_over_d,used");
    let mut panels = Vec::new();
    let mut behind = Vec::new();
    for judged in run.judged {
        let (Check::ApproachOrder(ApproachOrder { impact }), Some((_, _, fit))) = (&judged.claim.check, fit_of(judged))
        else {
            continue;
        };
        // These claims have k = 2.
        let constant = model_difference(*impact, 1.0, 2.0) * depth_ratio(*impact, 2.0);
        let equation = if *impact <= 2.0 * FRAC_PI_4 { 11 } else { 12 };
        for point in &fit.points {
            table.push([&judged.claim.id, impact, &point.step, &point.error, &(constant * point.step), &point.used]);
        }
        let order = fit.line.map_or_else(|| "—".to_owned(), |line| format!("{:.4}", line.order));
        let panel = Panel::new(
            format!("to Eq. {equation} at I = {impact}"),
            Axis::log("1/N", ""),
            Axis::log("|difference| of X/d", ""),
        )
        .series(
            format!("predicted: {} / N", number(constant, 4)),
            Style::line(0).ink(Ink::Orange),
            fit.points.iter().map(|p| (p.step, constant.abs() * p.step)),
        );
        panels.push(with_fit(panel, format!("solved: order {order}"), fit, Style::marks(0)));
        behind.push(judged);
    }
    behind.extend(run.judged.iter().filter(|j| matches!(j.claim.check, Check::ApproachConstant(_))));
    let figure = Figure::new(
        "approach-with-n",
        Section::Model,
        message(
            behind.iter().copied(),
            "Eq. 11-12",
            "is a limit, approached with order 1 in 1/N and with the predicted constant",
            "is not shown to be a limit with the predicted order and constant",
        ),
        "Points: depth at finite N less Eq. 11-12. Line: the first term of the expansion in 1/N, not fitted.",
        panels,
        table,
    )?;
    Some(figure.judged_by(ids(run, behind)))
}

/// Residual of the energy balance along the path.
fn energy(run: &Run<'_>) -> Option<Figure> {
    let with_points = run.judged.iter().filter_map(|j| match (&j.claim.check, &j.evidence) {
        (Check::EnergyBalance(_), Some(Evidence::Series { points, .. })) => Some((j, points)),
        _ => None,
    });
    let all: Vec<_> = with_points.collect();
    let mut scenes = grouped(&all, |(j, _)| j.claim.scene.as_deref().unwrap_or(""));
    // The scenes with most methods.
    scenes.sort_by_key(|(_, members)| std::cmp::Reverse(members.len()));
    scenes.truncate(3);
    let mut table = Table::new("scene,method,depth_m,residual_over_initial_energy");
    let mut panels = Vec::new();
    for (scene, members) in &scenes {
        let mut limits: Vec<f64> = members.iter().map(|(judged, _)| judged.claim.limit).collect();
        limits.sort_by(f64::total_cmp);
        limits.dedup();
        let residuals = Axis::log("|residual| / (M V₀²/2)", "").including(limits.iter().copied().chain([1e-17]));
        let mut panel = Panel::new(format!("scene {scene}"), Axis::linear("depth", "mm").including([0.0]), residuals);
        for limit in limits {
            panel = panel.slope("limit", 0.0, (0.0, limit));
        }
        for (index, (judged, points)) in members.iter().enumerate() {
            let method = judged.claim.method.map_or_else(String::new, |m| m.to_string());
            for (depth, residual) in *points {
                table.push([scene, &method, depth, residual]);
            }
            let points = points.iter().map(|(x, r)| (x * 1e3, r.abs().max(1e-17)));
            panel = panel.series(method, Style::marks(index), points);
        }
        panels.push(panel);
    }
    let behind: Vec<&Judged> =
        scenes.iter().flat_map(|(_, members)| members.iter().map(|(judged, _)| *judged)).collect();
    let figure = Figure::new(
        "energy-residual",
        Section::Energy,
        message(
            behind.iter().copied(),
            "The kinetic energy lost",
            "is the work done, all along the path",
            "is not the work done on every path",
        ),
        "Each point is the end of a step: kinetic energy lost less the work of the force up to there, which is integrated \
         apart from the method. Dashed: the limit of the claim. Residuals below 10⁻¹⁷ are drawn there.",
        panels,
        table,
    )?;
    Some(figure.judged_by(ids(run, behind)))
}

/// Differences from other programs in units of the tolerance.
fn peers(run: &Run<'_>) -> Option<Figure> {
    /// Smaller differences are drawn there.
    const LEAST: f64 = 1e-4;
    let mut table = Table::new("claim,peer,scene,tolerance,difference_over_tolerance,limit,verdict");
    let mut all = Vec::new();
    for judged in run.judged {
        let (Check::Peer(Peer { name, tolerance }), Some(measured)) = (&judged.claim.check, judged.measured) else {
            continue;
        };
        let scene = judged.claim.scene.as_deref().unwrap_or("");
        let verdict = judged.verdict.name();
        table.push([&judged.claim.id, name, &scene, tolerance, &measured, &judged.claim.limit, &verdict]);
        all.push((name, *tolerance, measured.abs().max(LEAST), judged));
    }
    let rows: Vec<Strip<'_>> = grouped(&all, |(name, ..)| *name)
        .into_iter()
        .map(|(name, members)| Strip {
            label: format!("{name}, tolerance {}", number(members[0].1, 2)),
            allowed: [0.5 * LEAST, members[0].3.claim.limit],
            target: None,
            dots: members.iter().map(|(_, _, shown, judged)| (*shown, [*shown; 2], *judged)).collect(),
        })
        .collect();
    let x = Axis::log("largest difference / tolerance", "").including([LEAST, 20.0]);
    let behind: Vec<&Judged> = all.iter().map(|(.., judged)| *judged).collect();
    let figure = Figure::new(
        "peer-differences",
        Section::CrossCode,
        message(
            behind.iter().copied(),
            "Other programs",
            "agree within their tolerance on every scene compared",
            "do not agree within their tolerance on every scene compared",
        ),
        "Each dot is one scene: the largest difference of any quantity, divided by its conditioning and by the tolerance \
         of the program. Shaded: within the limit. Differences below 10⁻⁴ are drawn there.",
        vec![strips("differences by program", x, &rows)],
        table,
    )?;
    Some(figure.judged_by(ids(run, behind)))
}

/// What is drawn over time: its name, its unit, and the number in it.
type Curve = (&'static str, &'static str, fn(&Sample) -> f64);

/// The panels of the solution of `problem`, and the solution; `None` if it has no end.
fn path_panels(name: &str, problem: &Problem, table: &mut Table) -> Option<(Vec<Panel>, Flight)> {
    let (samples, flight) = path_of(problem)?;
    for sample in &samples {
        let s = sample.state;
        table.push([&name, &s.time, &s.depth, &s.velocity, &sample.force, &sample.stage]);
    }
    let curves: [Curve; 3] = [
        ("depth", "mm", |s| s.state.depth * 1e3),
        ("velocity", "m/s", |s| s.state.velocity),
        ("force", "kN", |s| s.force * 1e-3),
    ];
    let panel = |(title, unit, value): Curve| {
        let y = Axis::linear(title, unit).including([0.0]);
        let mut panel = Panel::new(format!("{name}: {title}"), Axis::linear("time", "ms"), y)
            .described(format!("The projectile {}.", words_for_outcome(flight.outcome)))
            .tall(148.0);
        for event in &flight.events {
            panel = panel.upright(words_for_event(event.kind, problem), event.state.time * 1e3);
        }
        let points: Vec<Point> = samples.iter().map(|s| (s.state.time * 1e3, value(s))).collect();
        panel.series("", Style::line(0), points)
    };
    Some((curves.into_iter().map(panel).collect(), flight))
}

const PATH_COLUMNS: &str = "scene,time_s,depth_m,velocity_m_s,force_n,stage";
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
    let mut ends = Vec::new();
    let mut problems = problems(run);
    // Scenes of a crater and one tunnel with drag first: they show all that the equation has. Layers have their own.
    problems
        .sort_by_key(|(_, problem)| (problem.stages.len() > 2, !problem.stages.iter().any(|stage| stage.drag > 0.0)));
    for (name, problem) in problems {
        // Scenes with an event before the end, and each kind of end once.
        let mut rows = table.clone();
        let Some((drawn, flight)) = path_panels(&name, &problem, &mut rows) else { continue };
        if flight.events.len() < 2 || seen.contains(&flight.outcome.is_stop()) || seen.len() == SCENES_MAX {
            continue;
        }
        seen.push(flight.outcome.is_stop());
        table = rows;
        panels.extend(drawn);
        ends.push(format!("scene {name} {}", words_for_outcome(flight.outcome)));
    }
    let message = format!("The force acts in stages: {}", ends.join(", "));
    Figure::new("flights", Section::Model, message, PATH_READING, panels, table)
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
    let message = format!(
        "Through {} the force jumps at each boundary: scene {name} {}",
        count(layers, "layer"),
        words_for_outcome(flight.outcome)
    );
    Figure::new(format!("layers-{}", slug(&name)), Section::Layers, message, PATH_READING, panels, table)
}

/// Scenes in the order in which orders are asked of them, then the others.
pub fn scenes_in_order(run: &Run<'_>) -> Vec<String> {
    let mut names = scenes_by_variants(run, Quantity::Depth);
    let asked = run.judged.iter().filter(|j| matches!(j.claim.check, Check::Order(_)));
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
        Outcome::Undecided => "ends within the error bound of leaving",
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
