//! What the equation is used for: sweeps, the map of Eq. 11-12, measured depths, sensitivities.

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::edges::Violations;
use super::{LAWS, Subject, Worst, formulas, off};
use crate::integrators::outcome::{Events, Solved};
use crate::integrators::{Cost, Detail, Flight, IntegrationError, Integrator, MethodName};
use crate::physics::groups::dimensionless_energy;
use crate::physics::semi_empirical::CRATER_RATIO_OF_EQ15;
use crate::physics::{Criterion, Scene, semi_empirical};
use crate::physics::{Outcome, Parameter, Problem, Stage, State};
use crate::studies::sensitivity;
use crate::studies::sweep::{Axis, Plan};
use crate::studies::{applicability, critical_velocity, experiments, perforating_velocities, perforation_limit};

check! {
    /// Critical velocity and energies of every point of a sweep of H/d against the closed form of a scene built for that
    /// point alone, by both criteria; worst relative difference.
    Sweep {
        /// Smallest H/d.
        from: f64,
        /// Largest H/d.
        to: f64,
        /// How many, evenly.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        points: usize,
    } in Slab, "relative", by sweep, compares (Method Search | ClosedForm);
    /// Perforation limit of the scene by both criteria: critical velocity of that thickness against the impact speed, and
    /// Eq. 15 at the limit of Eq. 11-12 against the energy of the shot; worst relative difference.
    ThicknessLimit {} in Slab, "relative", by thickness_limit, compares (Method | ClosedForm Formulas);
    /// Depth computed at places of each line of equal error of Eq. 11-12, k = 2: worst relative distance of its error
    /// from that of the line.
    Map {
        /// How many places of each line.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        points: usize,
    } in Applicability, "relative", by map, compares (Method | Formulas);
    /// Median of predicted over measured depth of each set of the shipped data, shallow tests apart: worst distance
    /// from 1.
    MeasuredDepth {} in Measured, "relative", by measured_depth, compares (Method | Elsewhere);
    /// Elasticities of every quantity to every number of the scene, by the method against the closed form in dual
    /// numbers: worst difference, relative to those above 1.
    Sensitivities {} in Sensitivities, "relative", by sensitivities, compares (Method Duals | Duals ClosedForm);
    /// A scene where a soft stage ends at once for fast shots: the ends of the two intervals of impact velocities that
    /// perforate, against those by hand, relative.
    Intervals {} in Slab, "relative", by intervals, compares (Method Search | Itself);
    /// Outcomes as a function of the impact speed, known exactly: slow shots that never end, and behind them a narrow interval
    /// of the other outcome. Intervals that are not found, or whose ends lie elsewhere.
    HiddenIntervals {
        /// How many functions.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        functions: usize,
    } in Slab, "violations", counting hidden_intervals, compares nothing;
}

fn sweep(&Sweep { from, to, points }: &Sweep, subject: &Subject<'_>) -> Found {
    let scene = subject.scene()?;
    let axis = Axis { parameter: Parameter::ThicknessRatio, from, to, unit: None, count: points, logarithmic: false };
    let plan = Plan::new(scene.clone(), &[axis])?;
    let concrete = scene.concrete().ok_or_else(|| NotMeasured::skip("the scene is not of concrete"))?;
    let method = subject.method(None)?;
    let rows = plan.run(method.integrator());
    let mut worst = Worst::default();
    for (index, row) in rows.iter().enumerate() {
        holds!(row.error.is_empty(), "point {index}: {}", row.error);
        let ratio = from + (to - from) * index as f64 / (points - 1) as f64;
        let by = |criterion| -> Found<(f64, f64)> {
            let thickness = Some(ratio * concrete.diameter);
            let scene = Scene { thickness, criterion, ..scene.clone() };
            let velocity = critical_velocity::exact(&scene)?;
            Ok((velocity, dimensionless_energy(0.5 * scene.mass * velocity * velocity, concrete)))
        };
        let (full, ndrc) = (by(Criterion::FullDepth)?, by(Criterion::Ndrc)?);
        let own = if scene.criterion == Criterion::Ndrc { ndrc } else { full };
        for (found, exact) in [
            (row.critical_velocity_m_s, own.0),
            (row.dimensionless_energy, own.1),
            (row.energy_full_depth, full.1),
            (row.energy_ndrc, ndrc.1),
        ] {
            worst.take(off(found.unwrap_or(f64::NAN), exact), || format!("at H/d = {ratio:.4}"));
        }
    }
    Ok(worst.measurement().evidence(Evidence::Sweep { plan: Box::new(plan), rows }))
}

fn thickness_limit(subject: &Subject<'_>) -> Found {
    let scene = subject.scene()?;
    let speed = scene.velocity.ok_or_else(|| NotMeasured::skip("the scene gives no impact speed"))?;
    let is_layered = scene.concrete().is_some_and(|concrete| !concrete.layers.is_empty());
    applies!(!is_layered && subject.problem()?.laws.is_empty(), "layers have their thickness, and laws no exact V_c");
    let has_steps = subject.method_name().needs_diffsol() || subject.method_name() == MethodName::CentralDifference;
    applies!(!has_steps, "the bound is that of a method without a tolerance");
    let method = subject.method(None)?;
    let mut worst = Worst::default();
    let mut bounds = Vec::new();
    for criterion in [Criterion::FullDepth, Criterion::Ndrc] {
        let scene = Scene { criterion, ..scene.clone() };
        if criterion == Criterion::Ndrc && scene.concrete().is_none_or(|concrete| !concrete.layers.is_empty()) {
            continue;
        }
        let limit = perforation_limit::of_scene(&scene, method.integrator())?;
        let bound = limit.error.unwrap_or(f64::NAN);
        holds!(bound <= 1e-9 * limit.thickness, "a bound of {bound:e} m for {} m", limit.thickness);
        bounds.push((bound, limit.thickness));
        let wall = Scene { thickness: Some(limit.thickness), ..scene };
        worst.take(off(critical_velocity::exact(&wall)?, speed), || format!("by {criterion:?}"));
    }
    // The relation spreads the bound of the depth by its slope, unless an ulp of the thickness is more than either.
    if let ([(of_depth, depth), (of_relation, thickness)], Some(c)) = (&bounds[..], scene.concrete()) {
        let side = |factor: f64| {
            semi_empirical::perforated_thickness_ratio(depth / c.diameter * factor) / (depth / c.diameter)
        };
        let slope = (side(1.0 + 1e-6) - side(1.0 - 1e-6)) / 2e-6;
        let is_more = of_depth > &(2.0 * f64::EPSILON * depth) && of_relation > &(2.0 * f64::EPSILON * thickness);
        let spread = of_relation / of_depth;
        holds!(!is_more || off(spread, slope) < 1e-6, "the bound is spread by {spread}, at a slope of {slope}");
    }
    if let (Some([full, ndrc]), Some(c)) = (perforation_limit::of_eq11_12(scene)?, scene.concrete()) {
        let impact = scene.mass * speed.powi(2) / (c.static_factor * c.strength * c.diameter.powi(3));
        worst.take(off(semi_empirical::impact_function(full, c.crater_ratio), impact), || "by Eq. 11-12".to_owned());
        if c.crater_ratio == CRATER_RATIO_OF_EQ15 {
            worst.take(off(semi_empirical::eq15_unrounded(ndrc), 0.5 * impact), || "by Eq. 15".to_owned());
        }
    }
    Ok(worst.measurement())
}

fn map(&Map { points }: &Map, subject: &Subject<'_>) -> Found {
    const CRATER_RATIO: f64 = 2.0;
    let lines = applicability::lines(CRATER_RATIO);
    let mut worst = Worst::default();
    for line in &lines {
        for index in 0..points {
            let (impact, geometry) = line.points[index * (line.points.len() - 1) / (points - 1).max(1)];
            let solved = formulas::solved_depth_ratio(subject, Some(geometry), impact)?;
            let error = semi_empirical::depth_ratio(impact, CRATER_RATIO) / solved - 1.0;
            let place = || format!("on the line of {} at I = {impact:.4}, N = {geometry:.4}", line.level);
            worst.take(off(error.abs(), line.level), place);
        }
    }
    let scenes = experiments::marked(&experiments::shipped()?);
    Ok(worst.measurement().evidence(Evidence::Map { crater_ratio: CRATER_RATIO, lines, scenes }))
}

fn measured_depth(subject: &Subject<'_>) -> Found {
    let method = subject.method(None)?;
    let comparisons = experiments::compare(&experiments::shipped()?, None, &[], method.integrator())?;
    let deep: Vec<_> = comparisons.iter().filter(|c| !c.is_shallow()).cloned().collect();
    let mut worst = Worst::default();
    for set in experiments::summaries(&deep) {
        let place = || format!("in {}: median {:.3} of {} tests", set.set, set.median, set.experiments);
        worst.take((set.median - 1.0).abs(), place);
    }
    Ok(worst.measurement().evidence(Evidence::Depths(comparisons)))
}

fn sensitivities(subject: &Subject<'_>) -> Found {
    let scene = subject.scene()?;
    applies!(subject.problem()?.laws.is_empty(), "{LAWS}");
    let exact = sensitivity::by_closed_form(scene)?;
    let found = match subject.method_name() {
        MethodName::Taylor => sensitivity::by_taylor(scene),
        #[cfg(feature = "diffsol")]
        MethodName::Tsit45 => sensitivity::by_diffsol(scene, 1e-10),
        other => return Err(NotMeasured::skip(format!("{other} has no sensitivities"))),
    }?;
    let difference = exact
        .disagreement(&found)
        .ok_or_else(|| NotMeasured::skip("no quantity of the scene has a derivative in closed form"))?;
    Ok(Measurement::new(difference).remark(format!("{} numbers", exact.entries.len())))
}

fn intervals(subject: &Subject<'_>) -> Found {
    // 10 kN until V = v1 + x/tau, and 1 MN behind: a shot slower than v1 never meets that, one just above it at once.
    const TEXT: &str = "projectile.mass = 1\nimpact.velocity = 50\ntarget.thickness = 0.1\n\
        [parameters]\np = \"10 kN\"\nv1 = \"60 m/s\"\ntau = \"10 ms\"\n\
        [[stage]]\nforce = \"p\"\nuntil = \"V = v1 + x/tau\"\n[[stage]]\nstatic_force = 1e6\n";
    let (soft, hard, thickness, v1, tau) = (1e4_f64, 1e6_f64, 0.1_f64, 60.0_f64, 0.01_f64);
    // The place where a shot meets the end of the soft stage, and rests at the far side.
    let (mut low, mut high) = (0.0, thickness);
    for _ in 0..80 {
        let place = 0.5 * (low + high);
        let rests_inside = place + (v1 + place / tau).powi(2) / (2.0 * hard) < thickness;
        *if rests_inside { &mut low } else { &mut high } = place;
    }
    let second = ((v1 + low / tau).powi(2) + 2.0 * soft * low).sqrt();
    let scene = Scene::from_toml(TEXT, "intervals").map_err(|error| NotMeasured::broken(error.to_string()))?;
    let (found, one) = critical_velocity::speeds(&scene, subject.method(None)?.integrator())?;
    holds!(one.is_none(), "one critical velocity where there are two intervals");
    let ends: Vec<Option<f64>> = found
        .iter()
        .flat_map(|interval| [Some(interval.low.velocity), interval.high.map(|high| high.velocity)])
        .collect();
    let [Some(first), Some(last), Some(again), None] = ends[..] else {
        return Err(NotMeasured::broken(format!("the intervals are {found:?}")));
    };
    let exact = [(2.0 * soft * thickness).sqrt(), v1, second];
    let mut worst = Worst::default();
    for (end, exact) in [first, last, again].into_iter().zip(exact) {
        worst.take(off(end, exact), || format!("{end} m/s, and by hand {exact} m/s"));
    }
    Ok(worst.measurement())
}

/// Flights that end as a function of the impact speed says: the exit margin, or never.
struct Pretended<F>(F);

impl<F: Fn(f64) -> Option<f64>> Integrator for Pretended<F> {
    fn name(&self) -> &'static str {
        "pretended"
    }

    fn solve(&self, problem: &Problem, _: Detail) -> Solved {
        let end = State::at_impact(problem);
        let margin = (self.0)(problem.impact_speed).ok_or(IntegrationError::NeverEnds { why: "as said", last: end })?;
        Ok(Flight {
            outcome: if margin > 0.0 { Outcome::Perforated } else { Outcome::StoppedInTunnel },
            stage: 0,
            end,
            events: Events::new(),
            exit_margin: Some(margin),
            exit_margin_error: Some(0.0),
            cost: Cost::default(),
            trajectory: Vec::new(),
            step_limit: None,
            notes: Vec::new(),
        })
    }
}

fn hidden_intervals(
    &HiddenIntervals { functions }: &HiddenIntervals,
    subject: &Subject<'_>,
    seen: &mut Violations,
) -> Found<()> {
    let mut random = subject.random("hidden-intervals");
    for _ in 0..functions {
        let middle = random.log_uniform(1.0, 1e3);
        // Two speeds of the scan are 0.8 % apart.
        let half = middle * random.log_uniform(1e-4, 2e-3);
        let slow = middle * random.uniform(0.1, 0.9);
        let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
        // Steeper on one side, so that the search has to choose.
        let skew = random.uniform(-0.5, 0.5);
        let margin = |speed: f64| {
            let off = (speed - middle) / half;
            (speed >= slow).then(|| sign * (off * off - 1.0) * (1.0 + skew * off / (1.0 + off.abs())) / speed.powi(2))
        };
        let resolve = |speed| Ok(Problem::of_stages(1.0, speed, [Stage::tunnel(1.0, 0.0)]).with_exit(1.0));
        let found = perforating_velocities::perforating(resolve, &Pretended(margin), (middle, middle))?.intervals;
        let ends: Vec<f64> = found
            .iter()
            .flat_map(|interval| [Some(interval.low.velocity), interval.high.map(|high| high.velocity)])
            .flatten()
            .collect();
        let exact =
            if sign > 0.0 { vec![slow, middle - half, middle + half] } else { vec![middle - half, middle + half] };
        let holds = ends.len() == exact.len() && ends.iter().zip(&exact).all(|(end, exact)| off(*end, *exact) < 1e-12);
        seen.expect(holds, || format!("{ends:?} and not {exact:?}"));
    }
    Ok(())
}
