//! The paper's scheme against its step, and the largest step that holds an accuracy.
//!
//! An error that jumps from step to step (boundaries at step ends) passes a level by luck long before it keeps it. So a
//! step holds a level only if every smaller one that was tried holds it too: steps are walked down from one a flight
//! until a decade of them holds, the crossing is halved down to, and steps just below it are probed until none fails.
//! The step found is therefore never too small by more than the width of the halving, and too large only by what the
//! probes miss.

use schemars::JsonSchema;
use serde::Serialize;

use super::timing::{Effort, Timing};
use super::work_precision::variant_name;
use crate::integrators::{Boundaries, Cost, Detail, Flight, Integrator, Method, MethodName, MethodOptions, VelocityAt};
use crate::physics::{Problem, Scene};
use crate::studies::critical_velocity;
use crate::studies::error::{StudyError, Truth, flight_error, is_fixed, signed_error};
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;

/// Relative errors to hold: 1, 0.1, 0.01 and 0.001 %.
pub const LEVELS: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];

/// The quantities that are asked for, where the scene leaves them free.
pub const QUANTITIES: [Quantity; 4] = [Quantity::Depth, Quantity::Time, Quantity::Velocity, Quantity::CriticalVelocity];

/// Adaptive methods that stand beside the variants, as far as the build has them.
const ADAPTIVE: [MethodName; 2] = [MethodName::Taylor, MethodName::Tsit45];

/// Most steps of a flight that are tried.
const STEPS_MAX: f64 = 1e6;

/// Most steps of a flight in a search for V_c, which takes tens of flights.
const STEPS_MAX_CRITICAL: f64 = 1e5;

/// A point of a curve is seen beside its neighbours and deserves less effort than a size that is reported.
const POINT: Effort = Effort { samples: 3 };

/// Tolerances of the adaptive methods, from the loosest allowed.
const TOLERANCES: [f64; 2] = [1e-14, 0.1];

/// How sizes are tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// Largest size.
    pub from: f64,
    /// Smallest size.
    pub to: f64,
    /// Sizes in each decade, from large to small.
    pub per_decade: usize,
    /// Sizes tried just below a crossing, a round.
    pub probes: usize,
    /// Seed of the random ratios.
    pub seed: u64,
}

/// What was tried: size and error, descending; `None` where there is no error to measure.
pub type Tried = Vec<(f64, Option<f64>)>;

impl Walk {
    /// Width to which a crossing is halved down, relative.
    const WIDTH: f64 = 1e-3;
    /// Rounds of probes at most.
    const ROUNDS: usize = 12;

    /// Walks down until a whole decade holds the smallest of `levels`, or the smallest size is reached; then finds, for
    /// each level, the largest size that holds it. `None` where the smallest sizes tried do not.
    pub fn largest(self, levels: &[f64], error: &mut dyn FnMut(f64) -> Option<f64>) -> (Tried, Vec<Option<f64>>) {
        let finest = levels.iter().copied().fold(f64::INFINITY, f64::min);
        let tried = self.down(finest, error);
        let mut random = Random::for_part(self.seed, "probes");
        let held = levels.iter().map(|&level| self.crossing(level, &tried, &mut random, error)).collect();
        (tried, held)
    }

    fn down(self, finest: f64, error: &mut dyn FnMut(f64) -> Option<f64>) -> Tried {
        let mut random = Random::for_part(self.seed, "walk");
        let ratio = 10f64.powf(1.0 / self.per_decade as f64);
        let (mut tried, mut size, mut holding) = (Tried::new(), self.from, 0);
        while size >= self.to && holding < self.per_decade {
            let found = error(size);
            holding = if holds(found, finest) { holding + 1 } else { 0 };
            tried.push((size, found));
            // Random ratios: a fixed one may fall into step with the teeth of the error.
            size /= ratio.powf(random.uniform(0.7, 1.3));
        }
        tried
    }

    fn crossing(
        self,
        level: f64,
        tried: &Tried,
        random: &mut Random,
        error: &mut dyn FnMut(f64) -> Option<f64>,
    ) -> Option<f64> {
        let holding = tried.iter().rev().take_while(|(_, found)| holds(*found, level)).count();
        if holding == 0 {
            return None;
        }
        let first = tried.len() - holding;
        let mut held = tried[first].0;
        if first > 0 {
            held = halved(held, tried[first - 1].0, level, error);
        }
        for _ in 0..Self::ROUNDS {
            // Half of them close below, where a tooth that still fails is rarest.
            let from = |index: usize| if index.is_multiple_of(2) { 0.9 * held } else { 0.5 * held };
            let mut probes: Vec<f64> = (0..self.probes).map(|index| random.log_uniform(from(index), held)).collect();
            probes.sort_by(f64::total_cmp);
            let Some(failing) = probes.iter().position(|&size| !holds(error(size), level)) else { break };
            // The probes below it hold; where there is none, the whole stretch is given up.
            let below = failing.checked_sub(1).map_or(0.5 * held, |index| probes[index]);
            held = if holds(error(below), level) { halved(below, probes[failing], level, error) } else { below };
        }
        Some(held)
    }
}

fn holds(error: Option<f64>, level: f64) -> bool {
    error.is_some_and(|error| error.abs() <= level)
}

/// A size that holds between `held`, which does, and `failing`, which does not, next to one that fails.
fn halved(mut held: f64, mut failing: f64, level: f64, error: &mut dyn FnMut(f64) -> Option<f64>) -> f64 {
    while failing > held * (1.0 + Walk::WIDTH) {
        let middle = (held * failing).sqrt();
        if holds(error(middle), level) {
            held = middle;
        } else {
            failing = middle;
        }
    }
    held
}

/// A size that was tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Point {
    /// Step (s) of a variant, tolerance of an adaptive method.
    pub size: f64,
    /// Error, absolute; `null` with another outcome than the exact one.
    pub error: Option<f64>,
    /// Time of one flight, or of one search for V_c (ns); `null` where there was no answer.
    pub time_ns: Option<f64>,
}

/// The largest size that holds a level, and what it costs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Held {
    /// Error to hold.
    pub level: f64,
    /// Largest step (s) or tolerance such that it and every smaller one that was tried hold the level; `null` if none.
    pub size: Option<f64>,
    /// Steps of one flight, or of all flights of one search for V_c.
    pub steps: Option<u64>,
    /// Evaluations of the force.
    pub force_evaluations: Option<u64>,
    /// Time of one flight, or of one search.
    pub time: Option<Timing>,
}

/// One method for a quantity, over its size.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Curve {
    /// `lagged/step-end` and the like, or the name of an adaptive method.
    pub method: String,
    /// Whether sizes are tolerances and not steps.
    pub adaptive: bool,
    /// Sizes tried, descending.
    pub points: Vec<Point>,
    /// The largest that hold each level.
    pub held: Vec<Held>,
}

/// One quantity of one scene by all variants and the adaptive methods.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StepStudy {
    /// Scene.
    pub scene: String,
    /// Quantity.
    pub quantity: Quantity,
    /// Time of the exact flight (s), which is the largest step tried.
    pub flight_time_s: f64,
    /// Curves: the nine variants, then the adaptive methods.
    pub curves: Vec<Curve>,
}

/// One quantity of one scene, ready to be computed by anything.
#[derive(Clone, Debug)]
struct Question<'a> {
    scene: &'a Scene,
    problem: &'a Problem,
    exact: &'a Flight,
    /// Exact critical velocity (m/s), where that is the quantity.
    critical: Option<f64>,
    quantity: Quantity,
}

impl Question<'_> {
    /// Error and cost with `method`; `None` without an answer.
    fn answer(&self, method: &dyn Integrator) -> Option<(Option<f64>, Cost)> {
        if let Some(critical) = self.critical {
            let found = critical_velocity::of_scene(self.scene, method).ok()?;
            let error = signed_error(self.quantity, found.velocity, critical, 1.0).abs();
            return Some((error.is_finite().then_some(error), found.cost));
        }
        let flight = method.solve(self.problem, Detail::Events).ok()?;
        Some((flight_error(self.quantity, &flight, self.exact, self.problem.impact_speed).map(f64::abs), flight.cost))
    }

    fn curve(
        &self,
        method: String,
        name: MethodName,
        walk: Walk,
        effort: Effort,
        with_size: &dyn Fn(f64) -> MethodOptions,
    ) -> Curve {
        let build = |size: f64| Method::new(name, &with_size(size)).ok();
        let answer = |size: f64| self.answer(build(size)?.integrator());
        let time = |size: f64, effort: Effort| {
            let method = build(size)?;
            Some(effort.time(&mut || {
                let _ = std::hint::black_box(self.answer(method.integrator()));
            }))
        };
        let (tried, held) = walk.largest(&LEVELS, &mut |size| answer(size)?.0);
        let points = tried
            .into_iter()
            .map(|(size, error)| {
                let time_ns = error.and_then(|_| time(size, POINT)).map(|time| time.median_ns);
                Point { size, error, time_ns }
            })
            .collect();
        let held = LEVELS
            .into_iter()
            .zip(held)
            .map(|(level, size)| {
                let cost = size.and_then(&answer).map(|(_, cost)| cost);
                Held {
                    level,
                    size,
                    steps: cost.map(|cost| cost.steps),
                    force_evaluations: cost.map(|cost| cost.force_evaluations),
                    time: size.and_then(|size| time(size, effort)),
                }
            })
            .collect();
        Curve { method, adaptive: name != MethodName::CentralDifference, points, held }
    }
}

/// The studies of `scene`, one for each free quantity of [`QUANTITIES`].
///
/// # Errors
/// [`StudyError`]: the scene does not resolve, or has nothing to measure by.
pub fn of_scene(name: &str, scene: &Scene, effort: Effort, seed: u64) -> Result<Vec<StepStudy>, StudyError> {
    let problem = scene.problem()?;
    let exact = Truth::of(&problem)?.flight;
    let plain = MethodOptions::default();
    let mut studies = Vec::new();
    let is_thick = problem.has_exit() && scene.thickness.is_some_and(|thickness| thickness > 0.0);
    let critical = is_thick.then(|| critical_velocity::exact_or_refined(scene).ok()).flatten();
    // A target that never stops the projectile has none; the other quantities go on. At rest at once, nothing is free.
    let critical = critical.filter(|velocity| *velocity > 0.0);
    let free = |quantity: &Quantity| match quantity {
        _ if exact.end.time <= 0.0 || is_fixed(*quantity, &exact) => false,
        Quantity::CriticalVelocity => critical.is_some(),
        _ => true,
    };
    for quantity in QUANTITIES.into_iter().filter(free) {
        let critical = critical.filter(|_| quantity == Quantity::CriticalVelocity);
        let question = Question { scene, problem: &problem, exact: &exact, critical, quantity };
        let steps_max = if critical.is_some() { STEPS_MAX_CRITICAL } else { STEPS_MAX };
        let time = exact.end.time;
        let steps = Walk { from: time, to: time / steps_max, per_decade: 12, probes: 128, seed };
        let mut curves = Vec::new();
        for velocity in VelocityAt::ALL {
            for boundaries in Boundaries::ALL {
                let options = MethodOptions { velocity: Some(velocity), events: Some(boundaries), ..plain.clone() };
                let with_size = |dt| MethodOptions { dt: Some(dt), ..options.clone() };
                let name = variant_name(velocity, boundaries);
                curves.push(question.curve(name, MethodName::CentralDifference, steps, effort, &with_size));
            }
        }
        let tolerances = Walk { from: TOLERANCES[1], to: TOLERANCES[0], per_decade: 4, probes: 8, seed };
        for name in ADAPTIVE.into_iter().filter(|name| name.is_built()) {
            let with_size = |rtol| MethodOptions { rtol: Some(rtol), ..plain.clone() };
            curves.push(question.curve(name.to_string(), name, tolerances, effort, &with_size));
        }
        studies.push(StepStudy { scene: name.to_owned(), quantity, flight_time_s: time, curves });
    }
    Ok(studies)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    fn walk() -> Walk {
        Walk { from: 1.0, to: 1e-7, per_decade: 12, probes: 128, seed: 5 }
    }

    #[test]
    fn of_a_power_law_the_largest_size_is_where_it_meets_the_level() {
        // error = C h^p meets the level at h = (level/C)^(1/p).
        for (constant, order) in [(0.3, 1.0), (7.0, 2.0), (1e-3, 1.0)] {
            let (_, held) = walk().largest(&LEVELS, &mut |h| Some(constant * h.powf(order)));
            for (level, held) in LEVELS.into_iter().zip(held) {
                let expected = (level / constant).powf(1.0 / order).min(1.0);
                let ratio = held.unwrap() / expected;
                assert!((1.0 - 2e-3..=1.0).contains(&ratio), "{constant} h^{order} at {level:e}: {ratio}");
            }
        }
    }

    #[test]
    fn a_sawtooth_is_held_by_its_envelope_and_not_by_a_lucky_tooth() {
        // The error of an event seen at a step's end: what is left of the step, anything from 0 to h.
        let error = |h: f64| Some(h * ((0.731 / h).ceil() - 0.731 / h));
        let (tried, held) = walk().largest(&LEVELS, &mut { error });
        for (level, held) in LEVELS.into_iter().zip(held) {
            let ratio = held.unwrap() / level;
            // No step up to the level can fail; beyond it the share that fails grows with the distance.
            assert!((1.0 - 2e-3..1.1).contains(&ratio), "{level:e}: {ratio}");
            let lucky = tried.iter().find(|(_, error)| holds(*error, level)).unwrap().0;
            assert!(lucky > 1.5 * held.unwrap(), "the first lucky step {lucky} proves nothing");
        }
    }

    #[test]
    fn a_size_that_holds_below_one_that_fails_is_no_answer_for_those_above() {
        // A lost outcome between 0.2 and 0.3 hides what holds above it.
        let error = |h: f64| if (0.2..0.3).contains(&h) { None } else { Some(1e-9) };
        let (_, held) = walk().largest(&[1e-3], &mut { error });
        assert!((held[0].unwrap() / 0.2 - 1.0).abs() < 2e-3, "{held:?}");
    }

    #[test]
    fn what_never_holds_has_no_size_and_the_walk_ends() {
        let (tried, held) = walk().largest(&LEVELS, &mut |_| Some(0.5));
        assert_eq!(held, [None; 4]);
        assert!(tried.last().unwrap().0 >= 1e-7 && tried.len() > 70, "{}", tried.len());
        assert_eq!(walk().largest(&LEVELS, &mut |_| None).1, [None; 4]);
        assert_eq!(walk().largest(&LEVELS, &mut |_| Some(f64::NAN)).1, [None; 4]);
    }

    /// The depth of the shipped `scene` by a variant: its problem, its exact flight, and the curve.
    fn depth(scene: &str, velocity: VelocityAt, boundaries: Boundaries) -> (Problem, Flight, Curve) {
        let scene = crate::testing::shipped(scene);
        let problem = scene.problem().unwrap();
        let exact = Truth::of(&problem).unwrap().flight;
        let quantity = Quantity::Depth;
        let question = Question { scene: &scene, problem: &problem, exact: &exact, critical: None, quantity };
        let time = exact.end.time;
        let steps = Walk { from: time, to: time / STEPS_MAX, per_decade: 12, probes: 128, seed: 3 };
        let variant = MethodOptions { velocity: Some(velocity), events: Some(boundaries), ..MethodOptions::default() };
        let with_size = |dt| MethodOptions { dt: Some(dt), ..variant.clone() };
        let effort = Effort { samples: 1 };
        let curve = question.curve(String::new(), MethodName::CentralDifference, steps, effort, &with_size);
        (problem, exact, curve)
    }

    #[test]
    fn at_rest_in_the_crater_the_largest_step_is_that_of_the_error_constant() {
        // X(dt)/X - 1 = (w dt)²/8 with rest located, and the envelope of what step ends leave (docs/theory.md, section 5).
        for (boundaries, most) in [(Boundaries::StepEnd, 1.05), (Boundaries::Interpolated, 1.02)] {
            let (problem, _, curve) = depth("crater", VelocityAt::LaggedHalfStep, boundaries);
            let w = (problem.stages[0].stiffness / problem.mass).sqrt();
            for held in &curve.held[1..] {
                let ratio = held.size.unwrap() * w / (8.0 * held.level).sqrt();
                assert!((0.98..most).contains(&ratio), "{boundaries} at {:e}: {ratio}", held.level);
            }
        }
    }

    #[test]
    fn with_lagged_drag_the_largest_step_is_that_of_the_error_constant() {
        // X(dt) - X = -D dt, D = V1 - P (T - t1)/M: the velocity lost to drag (docs/theory.md, section 5).
        let (problem, exact, curve) = depth("tunnel", VelocityAt::LaggedHalfStep, Boundaries::Landed);
        let start = exact.crater_end().unwrap();
        let lost = start.velocity - problem.stages[1].static_force * (exact.end.time - start.time) / problem.mass;
        for held in &curve.held[2..] {
            let ratio = held.size.unwrap() * lost / (held.level * exact.end.depth);
            assert!((ratio - 1.0).abs() < 0.02, "at {:e}: {ratio}", held.level);
            // Steps of the flight, and what they cost, are those of that step.
            let steps = exact.end.time / held.size.unwrap();
            assert!((held.steps.unwrap() as f64 / steps - 1.0).abs() < 0.02, "{held:?}");
            assert!(held.force_evaluations.unwrap() >= held.steps.unwrap() && held.time.is_some());
        }
    }

    #[test]
    fn steps_with_a_predicted_velocity_are_half_of_the_forces() {
        let (_, exact, curve) = depth("tunnel", VelocityAt::PredictedHalfStep, Boundaries::Interpolated);
        for held in &curve.held[2..] {
            let (steps, forces) = (held.steps.unwrap() as f64, held.force_evaluations.unwrap() as f64);
            let expected = exact.end.time / held.size.unwrap();
            assert!((steps / expected - 1.0).abs() < 0.02, "{held:?}");
            assert!((forces / steps - 2.0).abs() < 0.1, "{held:?}");
        }
    }
}
