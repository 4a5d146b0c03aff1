//! How fast do a method's answers converge, quantity by quantity?
//!
//! Fixed steps: the error over many step sizes with random ratios. Adaptive methods: the error over the tolerance
//! (slope 1 is proportional) and over 1/evaluations (slope is the order). The fit and its verdict are
//! [`super::order`]; what order to expect is [`super::formal_order`](mod@super::formal_order).

use std::cell::Cell;

use super::asymptotic::{Judged, Sample, TwoPowers, judge};
use super::audit::ErrorBand;
use super::critical_velocity;
use super::error::{Studied, StudyError, Truth, error_scale, flight_error, free_quantities, signed_error, value_of};
use super::formal_order::{Path, formal_order};
use super::grid_convergence::{GridValue, ThreeGrids, three_grids};
use super::order::{Class, Exclusion, FitError, FittedPoint, OrderFit, StepError, fit};
use super::perforating_velocities;
use super::quantity::Quantity;
use super::random::Random;
use super::verdict::Verdict;
use crate::integrators::central_difference::{MAX_STEPS, Steps};
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{CentralDifference, Detail, Flight, IntegrationError, Integrator, Solved};
use crate::physics::{Advice, EventKind, Problem, Scene};

/// Fewest sizes of a study, so that single unlucky ones do not decide.
pub const POINTS_DEFAULT: u16 = 60;

/// Smallest and largest step of a study over the time of the flight.
pub const STEPS_OVER_TIME: [f64; 2] = [1e-5, 1e-2];

/// Share of the motion, and of a stage on its path, that a step must not exceed to resolve it.
const WHOLE_SHARE: f64 = 0.05;
/// See [`WHOLE_SHARE`].
const STAGE_SHARE: f64 = 0.5;

/// Relative change of a velocity at an event, or of the time between two, up to which an error may follow a power.
const CHANGE_MAX: f64 = 0.25;

/// Most step sizes of a second range.
const FINER_POINTS: usize = 60;

/// Steps after which no further run of a range is begun, for each 100 runs: about half a second.
const STEPS_MAX: u64 = 60_000_000;

/// Steps that every run is allowed, beside four times those of the exact motion.
const PATIENCE: u64 = 10_000;

/// Speed relative to the impact velocity below which a flight has all but stopped.
const STILL: f64 = 1e-6;

/// Tolerances of a study of an adaptive method.
pub const TOLERANCES: [f64; 2] = [1e-11, 1e-4];

/// Ratio of the outermost sizes to their bounds: exp(pi/1000).
const INWARD: f64 = 1.003_146_532_3;

/// Steps or tolerances: how many, between which bounds, from which seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    /// Smallest.
    pub from: f64,
    /// Largest.
    pub to: f64,
    /// How many.
    pub points: usize,
    /// Seed.
    pub seed: u64,
}

impl Ladder {
    /// The sizes, descending, log-uniform with random ratios, and one near each bound.
    ///
    /// Not the bounds themselves: where they divide the time of the motion, an event falls on the end of a step, and
    /// its error is round-off.
    pub fn sizes(&self) -> Vec<f64> {
        let mut random = Random::for_part(self.seed, "ladder");
        let mut sizes: Vec<f64> =
            (0..self.points.saturating_sub(2)).map(|_| random.log_uniform(self.from, self.to)).collect();
        sizes.extend([self.from * INWARD, self.to / INWARD]);
        sizes.sort_by(|a, b| b.total_cmp(a));
        sizes
    }
}

/// What errors are measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Against {
    /// The exact value, in the unit of the quantity.
    pub exact: f64,
    /// What errors are relative to, in that unit.
    pub scale: f64,
}

impl Against {
    /// Of a quantity of the flight `exact` with that impact speed (m/s).
    fn of_flight(quantity: Quantity, exact: &Flight, impact_speed: f64) -> Self {
        // What a flight lacks is not studied.
        let exact = value_of(quantity, exact).unwrap_or(f64::NAN);
        Self { exact, scale: error_scale(quantity, exact, impact_speed) }
    }

    /// The value with this error.
    pub fn value(&self, error: f64) -> f64 {
        self.exact + error * self.scale
    }
}

/// The convergence of one quantity.
#[derive(Clone, Debug)]
pub struct QuantityStudy {
    /// Which.
    pub quantity: Quantity,
    /// What its errors are measured against.
    pub against: Against,
    /// Order expected.
    pub formal: Option<f64>,
    /// Error over the step or the tolerance.
    pub fit: Result<OrderFit, FitError>,
    /// Error over 1/evaluations, for methods of one order.
    pub work: Option<Result<OrderFit, FitError>>,
    /// Evaluations at each point of `fit`, in the order of ascending steps, for adaptive methods.
    pub evaluations: Vec<u64>,
    /// Sizes at which there was no error to measure: the outcome was not the exact one, the run failed, or it was not
    /// begun because the work allowed was spent.
    pub lost: usize,
    /// Whether the fit confirms the order expected.
    pub verdict: Verdict,
    /// Why the verdict is no plain pass, or which powers make it one; empty for a plain pass.
    pub reason: String,
    /// Leading and next power, where one alone does not hold.
    pub powers: Option<TwoPowers>,
}

impl QuantityStudy {
    /// Of the samples of a fixed step.
    fn of_steps(quantity: Quantity, against: Against, formal: Option<f64>, samples: &Samples) -> Self {
        let Judged { fit, verdict, mut reason, powers } = judge(&samples.found, formal);
        if verdict == Verdict::Undecided && samples.found.len() <= samples.lost {
            let why = samples.why.as_deref().unwrap_or("another outcome than the exact one");
            reason = format!("{} of {} runs are lost: {why}", samples.lost, samples.lost + samples.found.len());
        }
        let evaluations = Vec::new();
        Self { quantity, against, formal, fit, work: None, evaluations, lost: samples.lost, verdict, reason, powers }
    }

    /// The points that the order rests on, ascending; none where it converges to nothing.
    fn used(&self) -> Vec<FittedPoint> {
        let fit = self.fit.as_ref().ok().filter(|fit| fit.class == Class::Converging);
        fit.map_or(Vec::new(), |fit| fit.points.iter().filter(|point| point.used).copied().collect())
    }

    /// The error band of the value at the finest size that the order rests on: the law that was fitted, times what the worst
    /// of all errors has over it.
    pub fn error_band(&self) -> Option<ErrorBand> {
        let (used, line) = (self.used(), self.fit.as_ref().ok()?.line?);
        let law = |size: f64| line.error_constant * size.powf(line.order);
        let worst = used.iter().map(|point| point.error.abs() / law(point.step)).fold(0.0, f64::max);
        let half_width = worst * law(used.first()?.step) * self.against.scale.abs();
        let rule = "the fitted law times the worst of all errors over it";
        half_width.is_finite().then_some(ErrorBand { half_width, rule })
    }

    /// The rule for three grids on three of the sizes that the order rests on: the finest, the coarsest, and the one nearest
    /// to the middle between them. Neighbours would show how errors jump from step to step, and not how they fall.
    pub fn three_grids(&self) -> Option<ThreeGrids> {
        let used = self.used();
        let [first, last] = [used.first()?, used.last()?];
        let middle = (first.step * last.step).sqrt();
        let off = |point: &FittedPoint| (point.step / middle).ln().abs();
        let second = used.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let grid = |point: &FittedPoint| GridValue::new(point.step, self.against.value(point.error));
        three_grids([first, second, last].map(grid)).ok()
    }

    /// Whether other steps may decide what is not passed.
    fn is_open(&self) -> bool {
        self.verdict != Verdict::Passed && !self.fit.as_ref().is_ok_and(|fit| fit.class == Class::AtFloor)
    }

    /// Whether half of the errors or more are round-off: longer steps then show more, and finer ones nothing.
    fn drowns(&self) -> bool {
        let is_round_off =
            |point: &&FittedPoint| matches!(point.excluded, Some(Exclusion::ZeroError | Exclusion::RoundOffFloor));
        self.fit.as_ref().is_ok_and(|fit| 2 * fit.points.iter().filter(is_round_off).count() >= fit.points.len())
    }

    /// Says what would decide it, where steps up to `resolved` (s) resolve the motion.
    fn advise(&mut self, resolved: f64) {
        let finest = self.fit.as_ref().ok().and_then(|fit| fit.points.first()).map_or(resolved, |point| point.step);
        let [from, to] = if self.is_open() && !self.drowns() {
            [finest.min(resolved) * 1e-2, finest.min(resolved)]
        } else {
            [1e-3 * resolved, resolved]
        };
        self.reason += &format!("; try --dt {from:.0e}:{to:.0e}");
    }
}

/// Studies of the quantities of one scene.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// One of each free quantity.
    pub quantities: Vec<QuantityStudy>,
    /// Why the critical velocity is not among them, where it was asked for and the target has a far side.
    pub no_critical_velocity: Option<String>,
}

/// A study of the central difference over fixed steps.
#[derive(Clone, Copy)]
pub struct FixedSteps<'a> {
    /// The scheme of one step size (s): its steps may be equal, alternating and so on.
    pub scheme: &'a dyn Fn(f64) -> CentralDifference,
    /// Smallest and largest step (s). Without them each motion has [`STEPS_OVER_TIME`] of its own time, and quantities
    /// that these do not decide have finer steps, or longer ones where round-off hides the error, once.
    pub range: Option<[f64; 2]>,
    /// How many step sizes.
    pub points: usize,
    /// Seed of the sizes.
    pub seed: u64,
    /// Whether the critical velocity is studied too, where the scene has a thickness.
    pub with_critical: bool,
    /// Is given the runs done and those planned, after each run.
    pub progress: &'a dyn Fn(u64, u64),
}

/// Convergence of the central difference with the step, for every quantity that `exact` leaves free.
///
/// A run that fails costs its point alone.
///
/// # Errors
/// [`StudyError`], where the request is at fault.
pub fn of_fixed_steps(
    scene: &Scene,
    problem: &Problem,
    exact: &Flight,
    study: &FixedSteps<'_>,
) -> Studied<Convergence> {
    let has_critical = study.with_critical && problem.has_exit();
    let runs = Runs { counts: Cell::default(), progress: study.progress };
    runs.plan(study.points * if has_critical { 2 } else { 1 });
    let quantities: Vec<Quantity> = free_quantities(exact).collect();
    let solve = |size, max_steps| {
        let scheme = CentralDifference { max_steps, ..(study.scheme)(size) };
        let flight = scheme.solve_in(problem, Detail::Events).map_err(|error| {
            let steps = steps_before(&error, size);
            (error.into(), steps)
        })?;
        let sample = |&quantity| {
            let error = flight_error(quantity, &flight, exact, problem.impact_speed)?;
            let inside = resolves(size, &flight, exact, quantity);
            Some(Sample { point: StepError::new(size, error), inside })
        };
        Ok((quantities.iter().map(sample).collect(), flight.cost.steps))
    };
    let against = |quantity| Against::of_flight(quantity, exact, problem.impact_speed);
    let path = Path::of(problem, exact);
    let motion = Motion { quantities: &quantities, against: &against, exact, path, run: &solve };
    let mut found = Convergence { quantities: motion.study(study, &runs)?, no_critical_velocity: None };
    if has_critical {
        match of_critical_velocity(scene, study, &runs)? {
            Ok(studies) => found.quantities.extend(studies),
            Err(why) => found.no_critical_velocity = Some(why),
        }
    }
    Ok(found)
}

/// The study of the critical velocity at steps of the flight at that velocity, or why there is none.
fn of_critical_velocity(
    scene: &Scene,
    study: &FixedSteps<'_>,
    runs: &Runs<'_>,
) -> Studied<Result<Vec<QuantityStudy>, String>> {
    let velocity = match critical_velocity::exact_or_refined(scene) {
        Ok(velocity) => velocity,
        Err(error) => return Ok(Err(error.to_string())),
    };
    if velocity == 0.0 {
        let why = "it is 0: the target is perforated at any speed, and an error relative to it means nothing";
        return Ok(Err(why.to_owned()));
    }
    let critical = scene.resolve(velocity)?;
    if perforating_velocities::may_cross(&critical) {
        let why =
            "paths may cross here, so that the outcome may change where no energy vanishes: no order is expected of it";
        return Ok(Err(why.to_owned()));
    }
    let exact = match Truth::of(&critical) {
        Ok(truth) => truth.flight,
        Err(error) => return Ok(Err(error.to_string())),
    };
    let resolved = longest_resolved(&exact, Quantity::CriticalVelocity);
    let last = (0..critical.stages.len()).find(|&index| critical.stages[index].end >= critical.exit_depth);
    let is_approached = last.is_some_and(|index| {
        let law = &critical.stages[index];
        law.viscosity > 0.0 && law.static_force == 0.0 && law.stiffness == 0.0
    });
    let search = |size, max_steps| {
        let scheme = CentralDifference { max_steps, ..(study.scheme)(size) };
        let counted = Counted { scheme, size, steps: Cell::default() };
        let found = critical_velocity::of_scene(scene, &counted);
        let steps = counted.steps.get();
        let found = found.map_err(|error| (error.into(), steps))?;
        let error = signed_error(Quantity::CriticalVelocity, found.velocity, velocity, 1.0);
        let inside = size <= resolved && error.abs() <= CHANGE_MAX;
        let sample = error.is_finite().then_some(Sample { point: StepError::new(size, error), inside });
        Ok((vec![sample], steps))
    };
    let quantities = &[Quantity::CriticalVelocity];
    let against = |_| Against { exact: velocity, scale: velocity };
    let path = Path::of(&critical, &exact);
    let motion = Motion { quantities, against: &against, exact: &exact, path, run: &search };
    let mut studies = motion.study(study, runs)?;
    // The motion at V_c then has no end but the one that round-off gives it: no range of steps establishes an order.
    for study in studies.iter_mut().filter(|study| is_approached && study.verdict == Verdict::Failed) {
        study.verdict = Verdict::Undecided;
        study.reason += "; at V_c the exit is only approached, and no range of steps decides it";
    }
    Ok(Ok(studies))
}

/// The runs done and those planned.
struct Runs<'a> {
    counts: Cell<[u64; 2]>,
    progress: &'a dyn Fn(u64, u64),
}

impl Runs<'_> {
    fn plan(&self, more: usize) {
        let [done, planned] = self.counts.get();
        self.counts.set([done, planned + more as u64]);
    }

    fn count(&self) {
        let [done, planned] = self.counts.get();
        self.counts.set([done + 1, planned]);
        (self.progress)(done + 1, planned);
    }
}

/// What a run gives: the sample of each quantity that it has, or why it failed, and the steps that it took.
type OfRun = Result<(Vec<Option<Sample>>, u64), (StudyError, u64)>;

/// Steps of `size` (s) that a flight took before it failed.
fn steps_before(error: &IntegrationError, size: f64) -> u64 {
    match error {
        IntegrationError::StepBudgetSpent { max_steps, .. } => *max_steps,
        IntegrationError::NotFinite { last, .. } | IntegrationError::NeverEnds { last, .. } => {
            (last.time / size) as u64
        }
        _ => 0,
    }
}

/// A scheme of equal steps in a search for the critical velocity, with its steps counted, those of failed flights too.
struct Counted {
    scheme: CentralDifference,
    size: f64,
    steps: Cell<u64>,
}

impl Integrator for Counted {
    fn name(&self) -> &'static str {
        self.scheme.name()
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        let solved = self.scheme.solve(problem, detail).map_err(|error| match error {
            // What has all but stopped at the end of its steps approaches a depth, and would for ever.
            IntegrationError::StepBudgetSpent { last, .. } if last.velocity < STILL * problem.impact_speed => {
                IntegrationError::NeverEnds { why: "it has all but stopped", last }
            }
            other => other,
        });
        let steps = solved.as_ref().map_or_else(|error| steps_before(error, self.size), |flight| flight.cost.steps);
        self.steps.set(self.steps.get() + steps);
        solved
    }
}

/// The samples of one quantity.
#[derive(Clone, Default)]
struct Samples {
    found: Vec<Sample>,
    lost: usize,
    /// What the first run that failed said.
    why: Option<String>,
}

/// One motion that is run at many step sizes: the flight of the scene, or those that find its critical velocity.
struct Motion<'a> {
    quantities: &'a [Quantity],
    /// What the errors of each are measured against.
    against: &'a dyn Fn(Quantity) -> Against,
    /// The exact flight, and the facts about it.
    exact: &'a Flight,
    path: Path,
    /// A run with this step size (s) and that many steps at most.
    run: &'a dyn Fn(f64, u64) -> OfRun,
}

impl Motion<'_> {
    /// The study of each quantity.
    fn study(&self, study: &FixedSteps<'_>, runs: &Runs<'_>) -> Studied<Vec<QuantityStudy>> {
        let time = self.exact.end.time;
        let [from, to] = study.range.unwrap_or(STEPS_OVER_TIME.map(|share| share * time));
        let base = Ladder { from, to, points: study.points, seed: study.seed };
        let mut samples = vec![Samples::default(); self.quantities.len()];
        let work = self.take(&base, &mut samples, runs)?;
        let CentralDifference { velocity, boundaries, steps, .. } = (study.scheme)(to);
        let judged = |samples: &[Samples]| -> Vec<QuantityStudy> {
            let of = |(&quantity, samples)| {
                let formal = formal_order(velocity, boundaries, &self.path, quantity).map(|order| match steps {
                    Steps::Automatic(_) => self.path.in_automatic_steps(order, boundaries, quantity),
                    _ => order,
                });
                QuantityStudy::of_steps(quantity, (self.against)(quantity), formal, samples)
            };
            self.quantities.iter().zip(samples).map(of).collect()
        };
        let mut studies = judged(&samples);
        if study.range.is_none() {
            let resolved = longest_resolved(self.exact, Quantity::Time);
            let points = base.points.min(FINER_POINTS);
            let seed = base.seed.wrapping_add(1);
            // Steps drawn log-uniformly over three decades take `points work/(7 from)` in all.
            let finest = points as f64 * work / (7.0 * STEPS_MAX as f64);
            let fine = (10.0 * from).min(resolved);
            let finer = Ladder { from: finest.max(1e-3 * fine), to: fine, points, seed };
            let coarser = Ladder { from: 0.1 * to, to: resolved, points, seed };
            for (ladder, drowns) in [(coarser, true), (finer, false)] {
                let is_due = |study: &QuantityStudy| study.is_open() && study.drowns() == drowns;
                if ladder.to > 4.0 * ladder.from && studies.iter().any(is_due) {
                    runs.plan(points);
                    self.take(&ladder, &mut samples, runs)?;
                    for (study, judged) in studies.iter_mut().zip(judged(&samples)) {
                        if study.is_open() {
                            *study = judged;
                        }
                    }
                }
            }
        }
        for study in studies.iter_mut().filter(|study| study.verdict == Verdict::Undecided) {
            study.advise(longest_resolved(self.exact, study.quantity));
        }
        Ok(studies)
    }

    /// Adds what the sizes of `ladder` give to `samples`, as far as [`STEPS_MAX`] allows, those that span it first.
    ///
    /// # Returns
    /// The steps of a run times their size, on average (s).
    fn take(&self, ladder: &Ladder, samples: &mut [Samples], runs: &Runs<'_>) -> Studied<f64> {
        let sizes = ladder.sizes();
        let most = STEPS_MAX * (1 + sizes.len() as u64 / 100);
        let (mut spent, mut time, mut taken) = (0, 0.0, 0);
        let spanning = [0, 4, 2, 6, 1, 5, 3, 7].into_iter().flat_map(|first| sizes.iter().skip(first).step_by(8));
        for &size in spanning {
            runs.count();
            if spent > most {
                for samples in &mut *samples {
                    samples.lost += 1;
                    samples.why.get_or_insert_with(|| format!("{most} steps are spent"));
                }
                continue;
            }
            let max_steps = PATIENCE.saturating_add((4.0 * self.exact.end.time / size) as u64).min(MAX_STEPS);
            match (self.run)(size, max_steps) {
                Ok((found, steps)) => {
                    spent += steps;
                    time += steps as f64 * size;
                    taken += 1;
                    for (samples, found) in samples.iter_mut().zip(found) {
                        samples.lost += usize::from(found.is_none());
                        samples.found.extend(found);
                    }
                }
                Err((error, _)) if error.is_usage() => return Err(error),
                Err((error, steps)) => {
                    spent += steps;
                    for samples in &mut *samples {
                        samples.lost += 1;
                        samples.why.get_or_insert_with(|| error.to_string());
                    }
                }
            }
        }
        Ok(time / f64::from(taken.max(1)))
    }
}

/// Times (s) from one event of `flight` to the next, with the velocity at its end, up to the place of `quantity`.
fn passages(flight: &Flight, quantity: Quantity) -> impl Iterator<Item = (EventKind, f64, f64)> {
    let mut before = 0.0;
    let mut is_past = false;
    flight.events.iter().map_while(move |event| {
        let time = event.state.time - before;
        before = event.state.time;
        let was_past = is_past;
        is_past = quantity.is_at_crater_end() && event.kind == EventKind::CraterEnd;
        (!was_past).then_some((event.kind, time, event.state.velocity))
    })
}

/// The longest step (s) that resolves every stage on the path of `exact` to the place of `quantity`.
fn longest_resolved(exact: &Flight, quantity: Quantity) -> f64 {
    let whole: f64 = passages(exact, quantity).map(|(_, time, _)| time).sum();
    let stages = passages(exact, quantity).map(|(_, time, _)| time).filter(|time| *time > 0.0);
    stages.fold(WHOLE_SHARE * whole, |least, time| least.min(STAGE_SHARE * time))
}

/// Whether `flight`, of steps of `size` (s), is near enough to `exact` up to the place of `quantity` for its error to follow
/// a power: the same events, every stage resolved, and no time or velocity changed by more than [`CHANGE_MAX`].
fn resolves(size: f64, flight: &Flight, exact: &Flight, quantity: Quantity) -> bool {
    let near = |found: f64, exact: f64| (found - exact).abs() <= CHANGE_MAX * exact;
    size <= longest_resolved(exact, quantity)
        && passages(flight, quantity).count() == passages(exact, quantity).count()
        && passages(flight, quantity).zip(passages(exact, quantity)).all(|(found, exact)| {
            found.0 == exact.0 && (near(found.1, exact.1) || exact.1 <= 0.0) && near(found.2, exact.2)
        })
}

/// Convergence of an adaptive method with its tolerance and with its work, against `exact`.
///
/// # Errors
/// [`StudyError`].
pub fn of_tolerances(problem: &Problem, exact: &Flight, method: MethodName, ladder: Ladder) -> Studied<Convergence> {
    let mut flights = Vec::new();
    let mut order = None;
    for rtol in ladder.sizes() {
        let method = Method::new(method, &MethodOptions { rtol: Some(rtol), ..MethodOptions::default() })?;
        order = method.integrator().order();
        flights.push((rtol, method.integrator().solve(problem, Detail::Events)?));
    }
    // Ascending, as a fit lists its points.
    flights.reverse();
    let study = |quantity| {
        let measured: Vec<(f64, u64, f64)> = flights
            .iter()
            .filter_map(|(rtol, flight)| {
                let error = flight_error(quantity, flight, exact, problem.impact_speed)?;
                Some((*rtol, flight.cost.force_evaluations, error))
            })
            .collect();
        let over_tolerance: Vec<_> = measured.iter().map(|&(rtol, _, e)| StepError::new(rtol, e)).collect();
        let over_work: Vec<_> = measured.iter().map(|&(_, n, e)| StepError::new(1.0 / n.max(1) as f64, e)).collect();
        let fit = fit(&over_tolerance);
        // The class decides: a controller holds the error of a step, not of the flight.
        let is_converging = fit.as_ref().is_ok_and(|fit| fit.class == Class::Converging);
        let verdict = match &fit {
            _ if is_converging => Verdict::Passed,
            Ok(fit) => fit.verdict(1.0),
            Err(_) => Verdict::Undecided,
        };
        QuantityStudy {
            quantity,
            against: Against::of_flight(quantity, exact, problem.impact_speed),
            formal: Some(1.0),
            lost: flights.len() - measured.len(),
            reason: fit.as_ref().map_or_else(ToString::to_string, |fit| fit.reason.clone()),
            fit,
            work: order.map(|_| self::fit(&over_work)),
            evaluations: measured.iter().map(|&(_, n, _)| n).collect(),
            verdict,
            powers: None,
        }
    };
    Ok(Convergence { quantities: free_quantities(exact).map(study).collect(), no_critical_velocity: None })
}

#[cfg(test)]
mod tests;
