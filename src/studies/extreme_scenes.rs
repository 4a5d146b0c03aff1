//! Do the integrators agree anywhere? Random scenes over the whole admissible range, half of them aimed at the edges.
//!
//! A scene is a function of seed and number alone, so any of a million can be remade. Its problem is solved by the
//! closed form, the Taylor series and the energy formulation in `f64`, and by the Taylor series and the energy
//! formulation in double-double, which judge the three; where an `f64` answer misses its limit, 50 digits
//! ([`crate::physics::reference`]) judge again. The limits:
//!
//! - **outcome**: that of the double-double margin, or `undecided`;
//! - **error bound**: the margin differs from the double-double one by no more than its error bound, and 16 roundings of
//!   its own where it is large;
//! - **end and crater end**: [`ULPS_MAX`] units of round-off times the condition number of the quantity, which is the
//!   sum over all inputs p of `|p df/dp|/|f|`, from dual numbers;
//! - **critical velocity**: the closed form and the search through the energy formulation, within the error bound of the
//!   latter and the same units; one that leaves the range of 64-bit numbers must be refused with that cause.

use std::cell::LazyCell;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;
use twofloat::TwoFloat;

use super::critical_velocity;
use super::error::{Errors, compare, conditions_in_dual_numbers, exceeds};
use super::quantity::Quantity;
use super::random::Random;
use super::random_scenes::errors_of;
use serde::Serialize;

use crate::integrators::{Detail, Energy, Flight, Method, MethodName, MethodOptions, Taylor};
use crate::physics::reference::{self, Exact, Source};
use crate::physics::{Advice, Concrete, CraterStiffness, Outcome, Problem, Resistance, Scalar, Scene, groups};

/// Largest error in units of round-off times max(1, condition number).
///
/// The closed form states 8. The integrators add a few roundings a step; the worst of 100,000 scenes is well below.
pub const ULPS_MAX: f64 = 64.0;

/// Errors up to this many units of round-off are accepted without a condition number.
const ULPS_UNCONDITIONED: f64 = 4.0;

/// Critical velocities (m/s) beyond which the search may end without one: it tries speeds up to 1e80 m/s.
const SEARCHED_MAX: f64 = 1e77;

/// Relative error of a margin that may exceed its error bound: no outcome depends on it.
const FAR_MARGIN_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Below this |W(k d)|/V0² the rest time is not compared: if the force jumps at k d, one ulp of an input decides in which
/// stage the projectile stops, and the time is as uncertain as the root of an ulp (`docs/theory.md`, section 8). The
/// depth is then as uncertain as the weaker stage makes it.
const CRATER_MARGIN_MIN: f64 = 64.0 * f64::EPSILON;

/// One scene of so many is solved in 50 digits too, whatever the methods say of it.
const SCENES_PER_REFERENCE: u64 = 9;

/// Defects that a summary keeps in full; all are counted.
const DEFECTS_KEPT: usize = 100;

/// The methods under test.
pub const METHODS: [MethodName; 3] = [MethodName::ClosedForm, MethodName::Taylor, MethodName::Energy];

/// Scene number `index` of `seed`: a plain draw if even, one aimed at an edge if odd.
pub fn scene(seed: u64, index: u64) -> Scene {
    let mut random = Random::for_part(seed, &format!("extreme scene {index}"));
    let mut scene = draw(&mut random);
    if index % 2 == 1 {
        aim(&mut scene, &mut random);
    }
    scene
}

/// I 1e-9 to 1e6, N 1e-3 to 1e12 or Q = 0, H/d 1e-3 to 1e3 or none, k 1e-8 to 10, d 1 um to 1 km; c continuous, or
/// given within a factor 100 of `P/(k d)`.
fn draw(random: &mut Random) -> Scene {
    let mut concrete = Concrete {
        diameter: random.log_uniform(1e-6, 1e3),
        nose_factor: random.log_uniform(0.01, 1.0),
        strength: random.log_uniform(1e6, 1e9),
        density: 0.0,
        static_factor: random.log_uniform(1.0, 100.0),
        follows_eq14: false,
        inertia_factor: 1.0,
        crater_ratio: if random.chance(0.05) { 0.0 } else { random.log_uniform(1e-8, 10.0) },
        crater_stiffness: CraterStiffness::Continuous,
        layers: Vec::new(),
    };
    // Mean densities of the projectile from aerogel to beyond any metal.
    let mass = random.log_uniform(1.0, 1e5) * concrete.diameter.powi(3);
    if !random.chance(0.1) {
        let geometry = random.log_uniform(1e-3, 1e12);
        concrete.density = groups::density_for(geometry, mass, &concrete);
    }
    let velocity = groups::impact_speed_for(random.log_uniform(1e-9, 1e6), mass, &concrete);
    let thickness = (!random.chance(0.2)).then(|| concrete.diameter * random.log_uniform(1e-3, 1e3));
    if random.chance(0.3) && concrete.crater_ratio > 0.0 {
        let stiffness = static_force(&concrete) / concrete.crater_depth();
        concrete.crater_stiffness = CraterStiffness::Given(stiffness * random.log_uniform(1e-2, 1e2));
    }
    Scene { thickness, velocity: Some(velocity), ..Scene::of_concrete(mass, concrete) }
}

fn static_force(concrete: &Concrete) -> f64 {
    std::f64::consts::FRAC_PI_4 * concrete.diameter * concrete.diameter * concrete.static_factor * concrete.strength
}

/// `1 ± 10^-j`, j from 1 to 16, or up to three ulps off 1.
fn nearly_one(random: &mut Random) -> f64 {
    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
    if random.chance(0.25) {
        1.0 + sign * f64::EPSILON * random.below(4) as f64
    } else {
        1.0 + sign * 10f64.powf(-random.uniform(1.0, 16.0))
    }
}

/// Moves `scene` to an edge: grazing the far side, `H = k d`, rest at `k d`, all at once, vanishing `V0` or `H`,
/// round numbers that tie exactly, a great jump of the force at k d.
fn aim(scene: &mut Scene, random: &mut Random) {
    let edge = random.below(8);
    if edge == 6 {
        round_numbers(scene, random);
    }
    let Some(concrete) = scene.concrete().cloned() else { return };
    let crater_depth = concrete.crater_depth();
    if matches!(edge, 1 | 3) && crater_depth > 0.0 {
        scene.thickness = Some(crater_depth * nearly_one(random));
    }
    match edge {
        // Grazing, of a target with a far side.
        0 | 1 | 6 => {
            if scene.thickness.is_none() {
                scene.thickness = Some(concrete.diameter * random.log_uniform(1e-3, 1e3));
            }
            if let Ok(critical) = critical_velocity::exact(scene)
                && critical > 0.0
                // Double-double splits its factors, and has no squares of such speeds.
                && critical < SEARCHED_MAX
            {
                scene.velocity = Some(critical * if edge == 6 { 1.0 } else { nearly_one(random) });
            }
        }
        // Rest at k d, where V1 vanishes.
        2 | 3 => {
            let work = match concrete.crater_stiffness {
                CraterStiffness::Continuous => static_force(&concrete) * crater_depth,
                CraterStiffness::Given(stiffness) => stiffness * crater_depth * crater_depth,
            };
            let speed = (work / scene.mass).sqrt() * nearly_one(random);
            if speed > 0.0 {
                scene.velocity = Some(speed);
            }
        }
        4 => scene.velocity = scene.velocity.map(|v| v * random.log_uniform(1e-30, 1.0)),
        5 => scene.thickness = Some(concrete.diameter * random.log_uniform(1e-30, 1e-3)),
        _ => {
            if let (Resistance::Concrete(c), true) = (&mut scene.resistance, crater_depth > 0.0) {
                let stiffness = static_force(&concrete) / crater_depth * random.log_uniform(1e-8, 1e8);
                c.crater_stiffness = CraterStiffness::Given(stiffness);
            }
        }
    }
}

/// Every number a power of two, no drag in half of them: sums and products are exact, and ties are ties.
fn round_numbers(scene: &mut Scene, random: &mut Random) {
    let nearest = |x: f64| 2f64.powi(x.log2().round() as i32);
    scene.mass = nearest(scene.mass);
    scene.thickness = scene.thickness.map(nearest);
    scene.velocity = scene.velocity.map(nearest);
    if let Resistance::Concrete(c) = &mut scene.resistance {
        for number in [&mut c.diameter, &mut c.strength, &mut c.static_factor] {
            *number = nearest(*number);
        }
        if c.crater_ratio > 0.0 {
            c.crater_ratio = nearest(c.crater_ratio);
        }
        if random.chance(0.5) {
            c.density = 0.0;
        }
        c.crater_stiffness = match c.crater_stiffness {
            CraterStiffness::Given(stiffness) => CraterStiffness::Given(nearest(stiffness)),
            continuous @ CraterStiffness::Continuous => continuous,
        };
    }
}

/// An answer that misses its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "report", schemars(rename = "DefectJson"))]
pub struct Defect {
    /// Number of the scene.
    #[serde(rename = "scene")]
    pub index: u64,
    /// What is wrong, with the numbers.
    pub what: String,
}

/// Solves `scene`, number `index`, by every method and judges each.
///
/// A panic anywhere is a defect of the scene, not the end of the study.
pub fn examine(index: u64, scene: &Scene) -> Summary {
    let mut seen = Summary { scenes: 1, ..Summary::default() };
    if let Err(cause) = catch_unwind(AssertUnwindSafe(|| examine_unguarded(index, scene, &mut seen))) {
        let text = cause.downcast_ref::<String>().map(String::as_str).or(cause.downcast_ref::<&str>().copied());
        seen.defect(index, format!("panic: {}", text.unwrap_or_default()));
    }
    seen
}

fn examine_unguarded(index: u64, scene: &Scene, seen: &mut Summary) {
    match scene.problem() {
        Ok(problem) => {
            let examined = examine_problem(index, &problem, seen);
            examined.unwrap_or_else(|what| seen.defect(index, what));
            let examined = examine_critical(index, scene, seen);
            examined.unwrap_or_else(|what| seen.defect(index, what));
        }
        Err(error) => {
            if error.is_usage() {
                seen.defect(index, format!("an admissible scene is refused: {error}"));
            }
            seen.unresolved = 1;
        }
    }
}

/// Adds what the methods make of `problem`; the error says why there is nothing to judge them by.
fn examine_problem(index: u64, problem: &Problem, seen: &mut Summary) -> Result<(), String> {
    let fine = problem.cast::<TwoFloat>();
    let exact = Taylor::default().solve_in(&fine, Detail::Events);
    let exact = exact.map_err(|error| format!("no flight in double-double: {error}"))?;
    let margin = Energy::new().exit_margin_in(&fine);
    let margin = margin.map_err(|error| format!("no margin in double-double: {error}"))?;
    let margin = margin.map(|(value, error, _)| (value, error));
    let perforates = match margin {
        Some((value, error)) if value.value().abs() > error => value.value() > 0.0,
        // A tie finer than double-double, or no far side.
        Some(_) => {
            seen.asked_reference = 1;
            reference::flight(Source::Problem(problem)).map_or(exact.outcome, |flight| flight.outcome)
                == Outcome::Perforated
        }
        None => exact.outcome == Outcome::Perforated,
    };
    let conditions = LazyCell::new(|| conditions_in_dual_numbers(problem).ok());
    let jump = near_jump(problem);
    if index.is_multiple_of(SCENES_PER_REFERENCE) {
        examine_yardstick(index, problem, &exact, margin.map(|(margin, _)| margin.value()), jump, seen);
    }
    for method in METHODS {
        let solved = Method::new(method, &MethodOptions::default())
            .and_then(|method| method.integrator().solve(problem, Detail::Events));
        let tally = seen.tallies.entry(method).or_default();
        let flight = match solved {
            Ok(flight) => flight,
            Err(error) => {
                tally.refused += 1;
                seen.defect(index, format!("{method} gives up where others solve: {error}"));
                continue;
            }
        };
        let is_right = flight.outcome != Outcome::Undecided && (flight.outcome == Outcome::Perforated) == perforates;
        if is_right {
            tally.right += 1;
        } else if flight.outcome == Outcome::Undecided {
            tally.undecided += 1;
        } else {
            tally.wrong += 1;
            let margin = margin.map(|(margin, _)| margin.value());
            seen.defect(index, format!("{method} says {} at a margin of {margin:?}", flight.outcome));
        }
        if let (Some((exact, _)), Some(found), Some(bound)) = (margin, flight.exit_margin, flight.exit_margin_error) {
            let off = (TwoFloat::from(found) - exact).value().abs();
            // The error bound is there to decide the sign: far from zero, the rounding of the margin exceeds it.
            if exceeds(off, bound + FAR_MARGIN_ROUNDING * exact.value().abs()) {
                let what = format!("{method}: margin {found:e} is off by {off:.2e}, beyond its error bar {bound:.2e}");
                seen.defect(index, what);
            }
        }
        if !is_right || !exact.outcome.agrees_with(flight.outcome) {
            continue;
        }
        let mut errors = excused(Errors::in_double_double(&flight, &exact, problem.impact_speed), jump);
        if errors.exceed(ULPS_UNCONDITIONED) {
            if let Some(conditions) = &*conditions {
                errors = errors.over(conditions);
            }
            if errors.exceed(ULPS_MAX) {
                seen.asked_reference = 1;
                match errors_of(Source::Problem(problem), &flight) {
                    Ok(again) => errors = excused(again, jump),
                    Err(why) => seen.defect(index, format!("{method}: {why}")),
                }
            }
        }
        for (units, quantity) in errors.0 {
            if exceeds(units, ULPS_MAX) {
                seen.defect(index, format!("{method}: {quantity} is off by {units:.1} ulp x condition"));
            }
            seen.admit((method, quantity), Worst { units, index });
        }
    }
    Ok(())
}

/// Adds how the solution in double-double, which judges the others, compares with 50 digits, which share no code with it.
fn examine_yardstick(
    index: u64,
    problem: &Problem,
    fine: &Flight<TwoFloat>,
    margin: Option<f64>,
    jump: Option<f64>,
    seen: &mut Summary,
) {
    let source = Source::Problem(problem);
    let Ok(exact) = reference::flight(source) else { return };
    seen.asked_reference = 1;
    if let (Some(found), Some(right)) = (margin, &exact.exit_margin) {
        let off = right.error_over(found, &Exact::one()).abs();
        if exceeds(off, FAR_MARGIN_ROUNDING * (1.0 + found.abs())) {
            seen.defect(index, format!("double-double: margin {found:e} is off by {off:.2e} from 50 digits"));
        }
    }
    // Within a tie of double-double itself either outcome may stand there.
    if !fine.outcome.agrees_with(exact.outcome) {
        return;
    }
    match errors_of(source, &fine.values()) {
        Ok(errors) => {
            for (units, quantity) in excused(errors, jump).0 {
                if exceeds(units, ULPS_MAX) {
                    seen.defect(index, format!("double-double: {quantity} is off by {units:.1} ulp x condition"));
                }
            }
        }
        Err(why) => seen.defect(index, format!("double-double: {why}")),
    }
}

/// Where an ulp decides on which side of a force jump at k d the projectile stops: the force before over that behind, or
/// one if that is less. `None` elsewhere.
fn near_jump(problem: &Problem) -> Option<f64> {
    let crater = problem.crater?;
    let (law, beyond) = (&problem.stages[crater], &problem.stages[crater + 1]);
    let ratio = law.force(law.end, 0.0) / beyond.static_force;
    let speed = problem.impact_speed;
    let at_end = 1.0 - law.stiffness / problem.mass * (law.end / speed) * (law.end / speed);
    (at_end.abs() <= CRATER_MARGIN_MIN && (ratio - 1.0).abs() > 1e-6).then(|| ratio.max(1.0))
}

/// `errors` without what cannot be judged near a jump of the force ([`near_jump`]).
fn excused(mut errors: Errors, jump: Option<f64>) -> Errors {
    let Some(ratio) = jump else { return errors };
    errors.0.retain(|(_, quantity)| *quantity != Quantity::Time);
    for (units, _) in errors.0.iter_mut().filter(|(_, quantity)| *quantity == Quantity::Depth) {
        *units /= ratio;
    }
    errors
}

/// Adds how the two critical velocities of `scene` compare; the error says which one is missing.
fn examine_critical(index: u64, scene: &Scene, seen: &mut Summary) -> Result<(), String> {
    let Some(thickness) = scene.thickness else { return Ok(()) };
    let exact = critical_velocity::exact(scene);
    let found = critical_velocity::of_scene(scene, &Energy::new());
    let (exact, found) = match (exact, found) {
        (Ok(exact), Ok(found)) => (exact, found),
        (Err(_) | Ok(SEARCHED_MAX..), Err(_)) => {
            seen.critical_refused = 1;
            return Ok(());
        }
        (Ok(exact), Err(error)) => {
            return Err(format!("V_c = {exact:e} by the closed form, but the search says: {error}"));
        }
        (Err(error), Ok(found)) => {
            return Err(format!("V_c = {:e} by search, but the closed form says: {error}", found.velocity));
        }
    };
    seen.critical_found = 1;
    // The drag over the thickness stands in an exponent, whose digits it takes.
    let condition = scene.tunnel().map_or(2.0, |law| 2.0 + 2.0 * law.drag * thickness / scene.mass);
    let (off, bar) = ((found.velocity - exact).abs(), found.error_bar.unwrap_or(f64::NAN));
    let units = (off / exact / f64::EPSILON / condition).min(off / bar * ULPS_MAX);
    let mut units = if off == 0.0 { 0.0 } else { units };
    if exceeds(units, ULPS_MAX) {
        seen.asked_reference = 1;
        let source = Source::Scene(scene, 1.0);
        match (reference::critical(source), reference::critical_condition(source)) {
            (Ok(reference), Ok(condition)) => {
                let closed = reference.velocity.relative_error(exact) / f64::EPSILON / condition.max(1.0);
                let searched = reference.velocity.relative_error(found.velocity) / f64::EPSILON / condition.max(1.0);
                units = closed.max(searched);
                if exceeds(units, ULPS_MAX) {
                    let what = format!(
                        "V_c: closed form {exact:e} off by {closed:.1}, search {:e} ± {bar:.1e} off by {searched:.1} \
                         ulp x condition",
                        found.velocity
                    );
                    seen.defect(index, what);
                }
            }
            (Err(error), _) | (_, Err(error)) => seen.defect(index, format!("V_c has no reference: {error}")),
        }
    }
    seen.admit((MethodName::Energy, Quantity::CriticalVelocity), Worst { units, index });
    Ok(())
}

/// The worst error of a method in a quantity, and the scene that makes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// In units of round-off times condition.
    pub units: f64,
    /// Number of the scene.
    pub index: u64,
}

/// How often each verdict was given on a method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Tally {
    /// Right outcomes.
    pub right: u64,
    /// Outcomes inside the method's own error bar.
    pub undecided: u64,
    /// Scenes without an answer.
    pub refused: u64,
    /// Wrong outcomes.
    pub wrong: u64,
}

/// What many scenes showed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Summary {
    /// Scenes examined.
    pub scenes: u64,
    /// Scenes whose coefficients leave the range of 64-bit numbers.
    pub unresolved: u64,
    /// Scenes for which 50 digits were asked.
    pub asked_reference: u64,
    /// Critical velocities that agree.
    pub critical_found: u64,
    /// Critical velocities refused with their cause, as out of range.
    pub critical_refused: u64,
    /// Verdicts by method.
    #[serde(skip)]
    pub tallies: BTreeMap<MethodName, Tally>,
    /// Worst error by method and quantity.
    #[serde(skip)]
    pub worst: BTreeMap<(MethodName, Quantity), Worst>,
    /// Limits missed, all of them.
    pub defect_count: u64,
    /// The first of them by number.
    pub defects: Vec<Defect>,
}

impl Summary {
    fn defect(&mut self, index: u64, what: String) {
        self.defect_count += 1;
        self.defects.push(Defect { index, what });
    }

    fn admit(&mut self, key: (MethodName, Quantity), worst: Worst) {
        let held = self.worst.entry(key).or_insert(worst);
        // Of equal errors that of the first scene stays, whatever the threads did.
        if compare(worst.units, held.units).then(held.index.cmp(&worst.index)).is_gt() {
            *held = worst;
        }
    }

    /// With another part of the same study.
    #[must_use]
    pub fn merged(mut self, other: Self) -> Self {
        self.scenes += other.scenes;
        self.unresolved += other.unresolved;
        self.asked_reference += other.asked_reference;
        self.critical_found += other.critical_found;
        self.critical_refused += other.critical_refused;
        for (method, tally) in other.tallies {
            let own = self.tallies.entry(method).or_default();
            own.right += tally.right;
            own.undecided += tally.undecided;
            own.refused += tally.refused;
            own.wrong += tally.wrong;
        }
        for (key, worst) in other.worst {
            self.admit(key, worst);
        }
        self.defect_count += other.defect_count;
        self.defects.extend(other.defects);
        self.defects.sort_by_key(|defect| defect.index);
        self.defects.truncate(DEFECTS_KEPT);
        self
    }
}

/// Examines scenes 0 to `cases` of `seed` on every thread; `done` is called after each.
///
/// Memory does not grow with the number of scenes, and the result does not depend on the threads.
pub fn run(cases: u64, seed: u64, done: &(dyn Fn() + Sync)) -> Summary {
    (0..cases)
        .into_par_iter()
        .map(|index| {
            let summary = examine(index, &scene(seed, index));
            done();
            summary
        })
        .reduce(Summary::default, Summary::merged)
}

/// `scene`, one of a single concrete in SI units, as the text of a scene file that reads back to the same numbers.
///
/// `None` for a scene of stages or layers, which none here is.
pub fn scene_text(scene: &Scene, title: &str) -> Option<String> {
    let c = scene.concrete().filter(|c| c.layers.is_empty())?;
    let stiffness = match c.crater_stiffness {
        CraterStiffness::Continuous => "\"continuous\"".to_owned(),
        CraterStiffness::Given(value) => format!("{value:e}"),
    };
    let thickness = scene.thickness.map(|h| format!("thickness = {h:e}\n")).unwrap_or_default();
    let velocity = scene.velocity.map(|v| format!("\n[impact]\nvelocity = {v:e}\n")).unwrap_or_default();
    Some(format!(
        "title = \"{title}\"\n\n[projectile]\nmass = {:e}\ndiameter = {:e}\nnose = {{ factor = {:e} }}\n\n[target]\n\
         strength = {:e}\ndensity = {:e}\n{thickness}\n[resistance]\nS = {:e}\nB = {:e}\nk = {:e}\n\
         crater_stiffness = {stiffness}\n{velocity}",
        scene.mass, c.diameter, c.nose_factor, c.strength, c.density, c.static_factor, c.inertia_factor, c.crater_ratio,
    ))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::Integrator;

    #[test]
    fn a_scene_is_a_function_of_seed_and_number_and_reads_back_from_its_text() {
        for index in 0..200 {
            let made = scene(7, index);
            assert_eq!(made, scene(7, index));
            let title = format!("scene {index}");
            let text = scene_text(&made, &title).unwrap();
            let read = Scene::from_toml(&text, "made.toml").unwrap();
            assert_eq!(read, Scene { title: Some(title), ..made });
        }
        assert_ne!(scene(7, 0), scene(8, 0));
    }

    #[test]
    fn no_scene_of_the_first_thousand_misses_a_limit() {
        let summary = run(1000, 1, &|| {});
        assert_eq!(summary.defects, []);
        assert_eq!(summary.scenes, 1000);
        for (method, tally) in &summary.tallies {
            assert!(tally.right > 700 && tally.undecided > 0, "{method} {tally:?}");
        }
    }

    #[test]
    fn a_summary_does_not_depend_on_how_the_scenes_are_shared_out() {
        let one_by_one = (0..60).map(|i| examine(i, &scene(3, i))).reduce(Summary::merged).unwrap();
        assert_eq!(run(60, 3, &|| {}), one_by_one);
    }

    #[test]
    fn an_error_beyond_the_limit_is_seen() {
        let made = scene(1, 0);
        let problem = made.problem().unwrap();
        let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events).unwrap();
        let mut flight = Taylor::default().solve(&problem, Detail::Events).unwrap();
        flight.end.time *= 1.0 + 1e-10;
        let units = Errors::in_double_double(&flight, &exact, problem.impact_speed).0[1].0;
        assert!((units * f64::EPSILON - 1e-10).abs() < 1e-14, "{units}");
    }
}
