//! The critical velocity `V_c`: the impact speed at which the projectile just reaches the exit depth.
//!
//! `V_c` is the root of the signed exit energy `W(exit) = margin · V0²` sought against `u = V0²`, by the method of Brent
//! (argmin). Without viscosity W is affine in u (`docs/theory.md`, section 6), so two flights predict the root and the rest
//! confirm it; the outcome "perforated or not", the depth reached or the residual velocity in its place make Brent's
//! method stop at an end of its bracket or crawl, and what they give is recognised and refused here.
//!
//! `BrentRoot` itself cannot be left alone with an objective. It takes an end value of zero and a product of end
//! values that underflows for a bracket, a NaN for convergence, and its tolerance for an absolute one. So the bracket
//! is found and its signs are checked here, u is measured in units of the predicted root, and the value at the root it
//! returns is compared with the error bound of the flight that gave it.

use std::cell::{OnceCell, RefCell};

use argmin::core::{CostFunction, Executor, IterState, State as _, TerminationReason, TerminationStatus};
use argmin::solver::brent::BrentRoot;
use smallvec::SmallVec;
use thiserror::Error;

use super::error::Studied;
use super::perforating_velocities::{self, Edge, Interval, Perforating};
use crate::integrators::{Accuracy, Cost, IntegrationError, Integrator, Margin, MethodName, Taylor};
use crate::physics::{
    Advice, Concrete, CraterStiffness, Criterion, Problem, ResolveError, Resolved, Scene, Shown, Stage, Target,
    closed_form, exit_energy, scene::Ending,
};

/// Speed (m/s) at which the scene is first resolved, for its exit depth and static work.
const PROBE_SPEED: f64 = 1.0;

/// Relative half-width in u of the bracket around a predicted root. Wide against round-off and tolerances of 1e-6,
/// narrow enough for one secant step to leave nothing of an affine function's error.
const PREDICTION_WIDTH: f64 = 1.0 / 1_048_576.0;

/// Flights in which the root of an affine W is found and confirmed: the secant, its correction, one beside it.
const AT_ONCE_MAX: u32 = 4;

/// Expansions of the bracket, the factor squared each time: from 4 to beyond the range of the numbers.
const EXPANSIONS_MAX: u32 = 12;

/// By what the step beyond a predicted root grows from one to the next.
const OVERSHOOT: f64 = 4.0;

/// Smallest impact speed tried, relative to the first: a target perforated at that has no critical velocity but 0.
const SLOWEST: f64 = 1e-14;

/// Jump of W over u tolerated where a method states no error bound. A scheme that sees the exit at the end of its step
/// leaves far less at any sensible step; an outcome in place of a margin leaves one.
const JUMP_MAX: f64 = 0.1;

/// Share of `V_c` at which its error bound leaves no digit of it.
const UNDECIDED: f64 = 0.5;

/// Why a search ends without a root that takes [`FLIGHTS_MAX`].
const SPENT: &str = "the flights allowed are spent";

/// Most flights before the search counts as failed.
const FLIGHTS_MAX: u32 = 200;

/// A critical velocity and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalVelocity {
    /// `V_c` (m/s).
    pub velocity: f64,
    /// Half-width of its error bound [m/s]: that of W at `V_c` over dW/dV0. `None` where the method states none.
    pub error_bar: Option<f64>,
    /// Critical impact energy `E_c` = M `V_c²`/2 (J).
    pub energy: f64,
    /// Flights it took.
    pub evaluations: u32,
    /// Work of all flights.
    pub cost: Cost,
    /// Impact speeds (m/s) with opposite signs of W between which `V_c` was sought at last.
    pub bracket: (f64, f64),
    /// What a reader should know of the result. Empty in the ordinary case.
    pub note: &'static str,
}

/// The result of one flight: `u = V0²`, `W(exit)`, and the error bound of W (m²/s²).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Square of the impact speed.
    pub u: f64,
    /// Signed exit energy.
    pub w: f64,
    /// Error bound of `w`, where the method states one.
    pub bar: Option<f64>,
}

impl Point {
    /// Impact speed (m/s).
    pub fn velocity(self) -> f64 {
        self.u.sqrt()
    }
}

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "W = {} m²/s² at {} m/s", Shown(self.w), Shown(self.velocity()))
    }
}

/// What a search for it gives.
pub type Sought<T = CriticalVelocity> = Result<T, CriticalError>;

/// Why there is no critical velocity.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CriticalError {
    /// The target has no far side: a mistake of the caller, exit code 2.
    #[error("a semi-infinite target has no critical velocity: give it a thickness")]
    NoExit,
    /// The force is a table that ends in front of the far side: a mistake of the caller, exit code 2.
    #[error("the table of the force ends at x = {} m, in front of the exit: no critical velocity is known", Shown(*.0))]
    TableEnds(f64),
    /// The scene has no stages at this impact speed.
    #[error("the scene cannot be resolved at {} m/s: {cause}", Shown(*.velocity))]
    Scene {
        /// Impact speed (m/s).
        velocity: f64,
        /// What the scene says.
        cause: ResolveError,
    },
    /// A flight failed.
    #[error("the flight at {} m/s failed: {cause}", Shown(*.velocity))]
    Flight {
        /// Impact speed (m/s).
        velocity: f64,
        /// What the integrator says.
        cause: IntegrationError,
    },
    /// The margin of a flight was no number.
    #[error("the exit energy at {} m/s is {exit_energy}, not a finite number", Shown(*.velocity))]
    NotFinite {
        /// Impact speed (m/s).
        velocity: f64,
        /// The value found (m²/s²).
        exit_energy: f64,
    },
    /// W has the same sign, or is zero, at all speeds up to the largest tried.
    #[error("no critical velocity up to {} m/s: {low}, and still {high}", Shown(.high.velocity()))]
    NoBracket {
        /// The slowest flight.
        low: Point,
        /// The fastest flight.
        high: Point,
    },
    /// W changes sign without a root: it jumps, or is flat on one side.
    #[error(
        "the exit energy changes sign without a root, {at} between {low} and {high}: a method too coarse for the scene, \
         or one whose margin is not the signed energy"
    )]
    Jump {
        /// Where the search ended.
        at: Point,
        /// Lower end of the bracket.
        low: Point,
        /// Upper end of the bracket.
        high: Point,
    },
    /// The error bound leaves no digit of `V_c`: exit code 4.
    #[error(
        "V_c is undecided: {} m/s with an error bar of {} m/s, the exit energy lost in the error bar of the method",
        Shown(*.velocity), Shown(*.error_bar)
    )]
    Undecided {
        /// Where the search ended (m/s).
        velocity: f64,
        /// Half-width of the error bound there (m/s).
        error_bar: f64,
        /// What resolves more, by the method that was asked.
        remedy: &'static str,
    },
    /// Several intervals of impact speeds perforate, so that no one is critical.
    #[error("no velocity is critical: {}", intervals_text(.0))]
    Several(Vec<Interval>),
    /// No impact speed that was tried perforates.
    #[error("no impact velocity from {} to {} m/s perforates", Shown(.0.0), Shown(.0.1))]
    Never((f64, f64)),
    /// The tolerance was not reached.
    #[error("tolerance not reached after {flights} flights ({reason}), between {low} and {high}")]
    NotConverged {
        /// Flights solved.
        flights: u32,
        /// What the root finder said.
        reason: String,
        /// Lower end of the bracket.
        low: Point,
        /// Upper end of the bracket.
        high: Point,
    },
}

impl Advice for CriticalError {
    fn inner(&self) -> Option<&dyn Advice> {
        if let Self::Flight { cause, .. } = self { Some(cause) } else { None }
    }

    /// A scene that cannot be resolved counts as such.
    fn is_usage(&self) -> bool {
        matches!(self, Self::NoExit | Self::TableEnds(_) | Self::Scene { .. })
            || self.inner().is_some_and(Advice::is_usage)
    }

    fn is_undecided(&self) -> bool {
        matches!(self, Self::Undecided { .. })
    }

    fn help(&self) -> String {
        match self {
            Self::Undecided { remedy, .. } => (*remedy).to_owned(),
            Self::NoBracket { .. } => {
                "drag takes all speed over the thickness: check the thickness, the density and the mass; with \
                 central-difference, shorten --dt"
                    .to_owned()
            }
            Self::Several(_) => "`penetrode critical` lists them as perforating_velocities_m_s".to_owned(),
            Self::TableEnds(_) => "add rows to the table up to the exit".to_owned(),
            _ => self.inner().map_or_else(String::new, Advice::help),
        }
    }
}

/// Critical velocity of the target that `resolve` makes of an impact speed.
///
/// `resolve` is called for each speed: with the continuous crater constant the stages depend on V0. The exit depth
/// must not.
///
/// # Returns
/// The root of W(exit) over V0², to the round-off of W or the error bound of the integrator. An exit depth of zero, and a
/// target that is perforated at any speed (it only drives or drags), give `V_c = 0` with a note.
///
/// Flights: four as a rule where W is affine in V0², about twelve where viscosity bends it, up to fifty where the
/// integrator's W jumps.
///
/// # Errors
/// [`CriticalError`]. Each that ends a search shows both ends of the bracket.
pub fn critical_velocity(resolve: impl Fn(f64) -> Resolved, integrator: &dyn Integrator) -> Sought {
    within(FLIGHTS_MAX, resolve, integrator)
}

/// As [`critical_velocity`], in at most `flights_max` flights.
fn within(flights_max: u32, resolve: impl Fn(f64) -> Resolved, integrator: &dyn Integrator) -> Sought {
    let probe = resolve(PROBE_SPEED).map_err(|cause| CriticalError::Scene { velocity: PROBE_SPEED, cause })?;
    if !probe.has_exit() {
        return Err(CriticalError::NoExit);
    }
    if probe.exit_depth <= 0.0 {
        return Ok(at_any_speed(0.0, Tally::default(), "the target has no thickness"));
    }

    let search = Search { resolve, integrator, flights_max, tally: RefCell::default() };
    let Some(bracket) = search.bracket(&probe)? else {
        let slowest = search.tally.borrow().last.velocity();
        return Ok(at_any_speed(slowest, search.tally.take(), "the target is perforated at any speed"));
    };
    // The secant of any bracket of an affine W is the root, and one more flight confirms it. Where the error bounds hide
    // the root, the method of Brent halves the bracket; so the bracket is narrowed first.
    let affine = probe.stages.iter().all(|stage| stage.viscosity == 0.0);
    let at_once = if affine { search.refine(bracket, AT_ONCE_MAX)? } else { None };
    let (bracket, (root, slope)) = if let Some(found) = at_once {
        (bracket, found)
    } else {
        let bracket = if affine { search.narrow(bracket)? } else { bracket };
        let found = search.refine(bracket, flights_max)?;
        (bracket, found.ok_or_else(|| search.not_converged(SPENT.to_owned(), bracket))?)
    };
    let resolution = bracket.resolution();

    let is_root = match root.bar {
        Some(bar) => slope > 0.0 && root.w.abs() <= 2.0 * (bar + slope * resolution),
        None => root.w.abs() <= JUMP_MAX * root.u,
    };
    if !is_root {
        return Err(CriticalError::Jump { at: root, low: bracket.low, high: bracket.high });
    }
    let velocity = root.velocity();
    // dV = du / 2V.
    let error_bar = root.bar.map(|bar| ((bar + root.w.abs()) / slope + resolution) / (2.0 * velocity));
    let is_wide = |bar: f64| !(bar < UNDECIDED * velocity);
    let error_bar = match error_bar {
        // The slope may be that of the other side of a kink, such as drag behind a barrier leaves, and W of a law of its
        // own may touch zero as a square: ask flights.
        Some(bar) if is_wide(bar) || !probe.laws.is_empty() => {
            let seen = search.half_width(root, resolution).unwrap_or(f64::INFINITY) / (2.0 * velocity);
            Some(if is_wide(bar) { bar.min(seen) } else { bar.max(seen) })
        }
        ordinary => ordinary,
    };
    if let Some(error_bar) = error_bar.filter(|bar| is_wide(*bar)) {
        return Err(CriticalError::Undecided { velocity, error_bar, remedy: remedy(integrator.name()) });
    }
    let tally = search.tally.take();
    Ok(CriticalVelocity {
        velocity,
        error_bar,
        energy: 0.5 * probe.mass * root.u,
        evaluations: tally.flights,
        cost: tally.cost,
        bracket: (bracket.low.velocity(), bracket.high.velocity()),
        note: "",
    })
}

/// What resolves more of what is left of V0² than `method` does.
fn remedy(method: &str) -> &'static str {
    match method.parse().map(|name: MethodName| (name, name.accuracy())) {
        Ok((MethodName::Taylor, _)) => "--method energy has another error bound: compare with it",
        Ok((_, Accuracy::Tolerance)) => "--method taylor or energy, or a tighter --rtol, resolves more",
        Ok((_, Accuracy::Step)) => "--method taylor or energy, or a shorter --dt, resolves more",
        _ => "--method taylor resolves more",
    }
}

/// `V_c = 0`, up to `error_bar` (m/s).
fn at_any_speed(error_bar: f64, tally: Tally, note: &'static str) -> CriticalVelocity {
    CriticalVelocity {
        velocity: 0.0,
        error_bar: Some(error_bar),
        energy: 0.0,
        evaluations: tally.flights,
        cost: tally.cost,
        bracket: (0.0, tally.last.velocity()),
        note,
    }
}

/// Critical velocity of `scene` through `integrator`, to round-off or the integrator's error bound.
///
/// # Errors
/// [`CriticalError`].
pub fn of_scene(scene: &Scene, integrator: &dyn Integrator) -> Sought {
    if !scene.forces.is_empty()
        && scene.thickness.is_some()
        && let Ok(Problem { target: Target::StagesToEndOfTable, stages, .. }) = scene.resolve(PROBE_SPEED)
        && let [.., last, _] = &stages[..]
    {
        return Err(CriticalError::TableEnds(last.end));
    }
    if has_one_path(scene) {
        return of_unique(scene, integrator);
    }
    match perforating(scene, integrator)? {
        Some(found) => of_intervals(scene, &found),
        None => of_unique(scene, integrator),
    }
}

/// Whether every stage ends at a place, and no mass joins: paths in (x, W) cannot cross then.
fn has_one_path(scene: &Scene) -> bool {
    scene.ends.is_empty() && scene.criterion != Criterion::Plug
}

/// As [`of_scene`], for a scene whose paths cannot cross.
///
/// # Errors
/// [`CriticalError`].
fn of_unique(scene: &Scene, integrator: &dyn Integrator) -> Sought {
    let first = OnceCell::new();
    let resolve = |speed| match first.get() {
        Some(problem) => scene.resolve_from(problem, speed),
        None => scene.resolve(speed).inspect(|problem| first.set(problem.clone()).unwrap_or(())),
    };
    let reused = integrator.reusing();
    critical_velocity(resolve, reused.as_deref().unwrap_or(integrator))
}

/// The impact speeds that perforate `scene` through `integrator`, where they need not be all above one critical velocity;
/// `None` where they are.
///
/// # Errors
/// [`CriticalError`]: a scene or a flight failed, or the target has no far side.
pub fn perforating(scene: &Scene, integrator: &dyn Integrator) -> Sought<Option<Perforating>> {
    let probe = scene.resolve(PROBE_SPEED);
    let probe = probe.map_err(|cause| CriticalError::Scene { velocity: PROBE_SPEED, cause })?;
    if !perforating_velocities::may_cross(&probe) {
        return Ok(None);
    }
    if !probe.has_exit() {
        return Err(CriticalError::NoExit);
    }
    let named = scene.ends.iter().filter_map(|(_, end)| match end.condition {
        Some(Ending::Velocity(velocity)) => Some(velocity),
        _ => None,
    });
    let named = named.chain(scene.velocity.filter(|speed| *speed > 0.0));
    let work = lower_bound(&probe).sqrt();
    let (least, most) = named.fold((work, work), |(least, most), speed| (least.min(speed), most.max(speed)));
    let reused = integrator.reusing();
    let integrator = reused.as_deref().unwrap_or(integrator);
    let resolve = |speed| scene.resolve(speed);
    let found = if perforates_from_one_on(scene) {
        perforating_velocities::from_one_on(resolve, integrator, (least, most))
    } else {
        perforating_velocities::perforating(resolve, integrator, (least, most))
    };
    found.map(Some)
}

/// Whether all impact speeds above one perforate `scene` although paths may cross: a plug ([`perforating_velocities`]).
fn perforates_from_one_on(scene: &Scene) -> bool {
    scene.criterion == Criterion::Plug && scene.ends.is_empty() && scene.concrete().is_some()
}

/// The impact speeds that perforate `scene`, and its critical velocity if there is one.
///
/// # Errors
/// [`CriticalError`], several intervals excepted.
pub fn speeds(scene: &Scene, integrator: &dyn Integrator) -> Sought<(Vec<Interval>, Option<CriticalVelocity>)> {
    if has_one_path(scene) {
        let found = of_scene(scene, integrator)?;
        return Ok((vec![of_one(&found)], Some(found)));
    }
    match perforating(scene, integrator)? {
        None => {
            let found = of_unique(scene, integrator)?;
            Ok((vec![of_one(&found)], Some(found)))
        }
        Some(found) => {
            let one = if found.intervals.len() > 1 { None } else { Some(of_intervals(scene, &found)?) };
            Ok((found.intervals, one))
        }
    }
}

/// All speeds above one.
fn of_one(found: &CriticalVelocity) -> Interval {
    let low = Edge { velocity: found.velocity, error_bar: found.error_bar.unwrap_or(f64::NAN) };
    Interval { low, high: None }
}

/// V_c where one interval alone perforates.
fn of_intervals(scene: &Scene, found: &Perforating) -> Sought {
    let Perforating { ref intervals, tried, evaluations, cost } = *found;
    match intervals[..] {
        [] => Err(CriticalError::Never(tried)),
        [Interval { low, .. }] => Ok(CriticalVelocity {
            velocity: low.velocity,
            error_bar: Some(low.error_bar),
            energy: 0.5 * scene.mass * low.velocity * low.velocity,
            evaluations,
            cost,
            bracket: (low.velocity - low.error_bar, low.velocity + low.error_bar),
            note: if perforates_from_one_on(scene) {
                "of two projectiles the faster one breaks the plug no later: V_c was found by halving"
            } else {
                "paths may cross here: the velocities that perforate were found by a scan"
            },
        }),
        _ => Err(CriticalError::Several(intervals.clone())),
    }
}

/// Intervals for people.
fn intervals_text(intervals: &[Interval]) -> String {
    let text = |interval: &Interval| match interval.high {
        Some(high) => format!("{} to {} m/s", Shown(interval.low.velocity), Shown(high.velocity)),
        None => format!("{} m/s and above", Shown(interval.low.velocity)),
    };
    let all: Vec<_> = intervals.iter().take(SHOWN_MAX).map(text).collect();
    let more = if intervals.len() > SHOWN_MAX { ", and others" } else { "" };
    format!("velocities that perforate are {}{more}", all.join(", "))
}

/// Most intervals in a message.
const SHOWN_MAX: usize = 6;

/// Exact critical velocity of `scene` (m/s), where it has a closed form.
///
/// # Errors
/// [`NoClosedForm`](super::error::StudyError::NoClosedForm): no far side, a viscous stage, or out of range.
pub fn exact(scene: &Scene) -> Studied<f64> {
    let problem = scene.resolve(PROBE_SPEED)?;
    let critical = match scene.concrete() {
        Some(concrete) if concrete.layers.is_empty() && problem.laws.is_empty() => {
            closed_form::critical(&problem, concrete.crater_stiffness)?
        }
        // Layers with a continuous crater constant depend on V0 through it.
        Some(Concrete { crater_stiffness: CraterStiffness::Continuous, .. }) if problem.laws.is_empty() => {
            return of_layers(problem);
        }
        _ => closed_form::critical_of_stages(&problem)?,
    };
    Ok(critical.velocity)
}

/// Exact critical velocity (m/s) of layers behind a continuous crater (`docs/theory.md`, section 2).
///
/// ```text
/// H <= k d : as in one concrete, that of the layer just beyond k d
/// H >  k d : V1c² backwards from the exit,  V_c² = (V1c² (M + k d Q) + k d P)/M
/// ```
fn of_layers(mut problem: Problem) -> Studied<f64> {
    let Some(crater) = problem.crater else { return Ok(closed_form::critical_of_stages(&problem)?.velocity) };
    let (crater_depth, Stage { static_force, drag, .. }) = problem.crater_depth_and_tunnel();
    if problem.exit_depth <= crater_depth {
        return Ok(closed_form::critical(&problem, CraterStiffness::Continuous)?.velocity);
    }
    // With a crater without a force, the speed needed at the layers is that needed at the face.
    problem.stages[crater].stiffness = 0.0;
    let at_crater_end = closed_form::critical_of_stages(&problem)?.velocity;
    let crater_share = crater_depth / problem.mass;
    Ok((at_crater_end * at_crater_end * (1.0 + crater_share * drag) + crater_share * static_force).sqrt())
}

/// Exact critical velocity of `scene` (m/s), or the one found through the Taylor series to round-off.
///
/// # Errors
/// [`CriticalError`].
pub fn exact_or_refined(scene: &Scene) -> Sought<f64> {
    exact(scene).or_else(|_| Ok(of_scene(scene, &Taylor::default())?.velocity))
}

/// How much of V0² above the fastest flight known is looked at where the force has no value farther up.
const NO_FARTHER: f64 = 1e-9;

/// The results of two flights, W < 0 at `low` and W > 0 at `high`, strictly.
#[derive(Clone, Copy, Debug)]
struct Bracket {
    low: Point,
    high: Point,
}

impl Bracket {
    fn slope(&self) -> f64 {
        (self.high.w - self.low.w) / (self.high.u - self.low.u)
    }

    /// Where the secant of the ends is zero; between them, and exact to round-off for an affine W.
    fn secant_root(&self) -> f64 {
        let share = -self.low.w / (self.high.w - self.low.w);
        self.low.u + (self.high.u - self.low.u) * share
    }

    /// The ends closed in on by one more flight, where it lies between them.
    fn with(self, point: Point) -> Self {
        if point.u <= self.low.u || point.u >= self.high.u || point.w == 0.0 {
            self
        } else if point.w < 0.0 {
            Self { low: point, ..self }
        } else {
            Self { high: point, ..self }
        }
    }

    /// Half-width in u to which the root is sought: round-off, or a quarter of the error bound.
    ///
    /// The error bound at the root lies between those at the ends as the root does: it has a part that grows with u and one
    /// that does not, as W has.
    fn resolution(&self) -> f64 {
        let root = self.secant_root();
        let share = (root - self.low.u) / (self.high.u - self.low.u);
        let (low, high) = (self.low.bar.unwrap_or(0.0), self.high.bar.unwrap_or(0.0));
        let bar = low + (high - low) * share;
        (0.25 * bar / self.slope()).max(4.0 * f64::EPSILON * root)
    }
}

/// What was spent.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    flights: u32,
    cost: Cost,
    last: Point,
}

/// The search at one target: flights at one impact speed after another.
struct Search<'a, F> {
    resolve: F,
    integrator: &'a dyn Integrator,
    flights_max: u32,
    tally: RefCell<Tally>,
}

impl<F: Fn(f64) -> Resolved> Search<'_, F> {
    /// W(exit) at `V0² = u`, a finite number.
    fn at(&self, u: f64) -> Sought<Point> {
        let velocity = u.sqrt();
        let mut tally = self.tally.borrow_mut();
        if tally.flights >= self.flights_max {
            let (flights, end) = (tally.flights, tally.last);
            return Err(CriticalError::NotConverged { flights, reason: SPENT.to_owned(), low: end, high: end });
        }
        let problem = (self.resolve)(velocity).map_err(|cause| CriticalError::Scene { velocity, cause })?;
        let margin = match self.integrator.exit_margin(&problem) {
            // The projectile approaches a depth for ever: the energy it lacks follows from that depth.
            Err(IntegrationError::NeverEnds { why, last }) => {
                let w = exit_energy::energy_beyond_approach(&problem, last).ok_or_else(|| {
                    let cause = IntegrationError::NeverEnds { why, last };
                    CriticalError::Flight { velocity, cause }
                })?;
                let bar = 8.0 * f64::EPSILON * (u + w.abs());
                Some(Margin { value: w / u, error: Some(bar / u), cost: Cost::default() })
            }
            other => other.map_err(|cause| CriticalError::Flight { velocity, cause })?,
        };
        tally.flights += 1;
        let Some(margin) = margin else {
            return Err(CriticalError::NotFinite { velocity, exit_energy: f64::NAN });
        };
        tally.cost = tally.cost + margin.cost;
        let point = Point { u, w: margin.value * u, bar: margin.error.map(|error| error * u) };
        if !(u.is_finite() && point.w.is_finite() && point.bar.unwrap_or(0.0).is_finite()) {
            return Err(CriticalError::NotFinite { velocity, exit_energy: point.w });
        }
        tally.last = point;
        Ok(point)
    }

    /// As [`Search::at`] at `u`, or at the fastest above `known` (m²/s²) at which the force has a value, and why it has none farther
    /// up.
    fn at_or_below(&self, u: f64, known: f64) -> Sought<(Point, Option<CriticalError>)> {
        use IntegrationError::{NoForce, SpeedTableEnds};
        let at = |u: f64| match self.at(u) {
            Err(error @ CriticalError::Flight { cause: NoForce { .. } | SpeedTableEnds { .. }, .. }) => Ok(Err(error)),
            other => other.map(Ok),
        };
        let mut error = match at(u)? {
            Ok(point) => return Ok((point, None)),
            Err(error) => error,
        };
        let (mut low, mut high, mut fastest) = (known, u, None);
        while high > low * (1.0 + NO_FARTHER) {
            let middle = (low * high).sqrt();
            match at(middle)? {
                Ok(point) if point.w > 0.0 => return Ok((point, Some(error))),
                Ok(point) => (low, fastest) = (middle, Some(point)),
                Err(farther) => (high, error) = (middle, farther),
            }
        }
        match fastest {
            Some(point) => Ok((point, Some(error))),
            None => Err(error),
        }
    }

    /// Two flights with strictly opposite signs; `None` when the target is perforated however slow the projectile.
    fn bracket(&self, probe: &Problem) -> Sought<Option<Bracket>> {
        let first = self.at(lower_bound(probe))?;
        let (mut low, mut high) = (first, first);
        let (mut factor, mut beyond) = (4.0_f64, 2.0);
        if first.w > 0.0 {
            // Drive, or a crater constant that grew with the speed: V_c is below the bound, or nothing.
            let slowest = first.u * SLOWEST * SLOWEST;
            while low.w >= 0.0 {
                if low.u <= slowest {
                    return Ok(None);
                }
                if low.w > 0.0 {
                    high = low;
                }
                low = self.at((low.u / factor).max(slowest))?;
                factor *= factor;
            }
        } else {
            for expansion in 0.. {
                let before = high;
                // Where two stops show how W rises, the line through them is zero at a predicted root: go beyond it.
                let line = if expansion == 0 { f64::NAN } else { Bracket { low, high }.secant_root() };
                let is_prediction = line > high.u && line < 1e12 * high.u;
                let next = if is_prediction { beyond * line - (beyond - 1.0) * high.u } else { high.u * factor };
                if expansion == EXPANSIONS_MAX || !next.is_finite() {
                    return Err(CriticalError::NoBracket { low: first, high });
                }
                // Beyond the range of numbers nothing is found either.
                let (point, farther) = match self.at_or_below(next, high.u) {
                    Err(CriticalError::Scene { .. }) => return Err(CriticalError::NoBracket { low: first, high }),
                    found => found?,
                };
                high = point;
                if let (false, Some(error)) = (high.w > 0.0, farther) {
                    return Err(error);
                }
                if high.w > 0.0 {
                    low = if before.w < 0.0 { before } else { low };
                    break;
                }
                low = before;
                factor *= factor;
                if is_prediction {
                    beyond *= OVERSHOOT;
                }
            }
        }
        if low.w < 0.0 && high.w > 0.0 {
            Ok(Some(Bracket { low, high }))
        } else {
            Err(CriticalError::NoBracket { low, high })
        }
    }

    /// A bracket close around the root that the secant predicts, where W is affine enough for that to hold.
    fn narrow(&self, wide: Bracket) -> Sought<Bracket> {
        let root = wide.secant_root();
        // The bracket must be wide against the error bounds at its ends, else their signs mean nothing.
        let bar = 64.0 * wide.resolution() / root;
        let width = PREDICTION_WIDTH.max(bar);
        if width > 0.1 {
            return Ok(wide);
        }
        let above = self.at(root * (1.0 + width))?;
        let narrower = wide.with(above);
        if above.w <= 0.0 {
            return Ok(narrower);
        }
        Ok(narrower.with(self.at(root * (1.0 - width))?))
    }

    /// The distance in u from `root` to which flights decide on both sides of it that W is negative or positive; infinite
    /// where they do not.
    fn half_width(&self, root: Point, resolution: f64) -> Sought<f64> {
        let mut half_width = resolution;
        for side in [-1.0, 1.0] {
            loop {
                if half_width > UNDECIDED * root.u {
                    return Ok(f64::INFINITY);
                }
                let point = self.at(root.u + side * half_width)?;
                if side * point.w > point.bar.unwrap_or(f64::INFINITY) {
                    break;
                }
                half_width *= 16.0;
            }
        }
        Ok(half_width)
    }

    fn not_converged(&self, reason: String, bracket: Bracket) -> CriticalError {
        let flights = self.tally.borrow().flights;
        CriticalError::NotConverged { flights, reason, low: bracket.low, high: bracket.high }
    }

    /// The point at the root within a bracket, by the method of Brent, and dW/du there; `None` if `flights_max` more
    /// flights do not find it.
    fn refine(&self, bracket: Bracket, flights_max: u32) -> Sought<Option<(Point, f64)>> {
        let resolution = bracket.resolution();
        let unit = bracket.secant_root();
        let objective = Objective {
            search: self,
            unit,
            scale: bracket.low.w.abs().max(bracket.high.w),
            known: [bracket.low, bracket.high],
            points: RefCell::default(),
        };
        // The solver stops at a half-width of 2 eps |b| + tol/2.
        let tolerance = 2.0 * resolution / unit - 4.0 * f64::EPSILON;
        let solver = BrentRoot::new(bracket.low.u / unit, bracket.high.u / unit, tolerance.max(0.0));
        // The iteration that sees the end takes no flight.
        let iterations = u64::from(flights_max) + 1;
        let run = Executor::new(&objective, solver)
            .configure(|state: IterState<f64, (), (), (), (), f64>| state.max_iters(iterations))
            .ctrlc(false)
            .timer(false)
            .run();
        let failed = |reason: String| self.not_converged(reason, bracket);
        let run = run.map_err(|error| match error.downcast() {
            Ok(CriticalError::NotConverged { reason, .. }) => failed(reason),
            Ok(of_a_flight) => of_a_flight,
            Err(error) => failed(error.to_string()),
        });
        let state = run?.state;
        match state.get_termination_status() {
            TerminationStatus::Terminated(TerminationReason::SolverConverged) => {}
            TerminationStatus::Terminated(TerminationReason::MaxItersReached) => return Ok(None),
            other => return Err(failed(other.to_string())),
        }
        // The last value and not the best one. At a root they are the same. Where W jumps, the best may be the first
        // point on the lower side, while the last lies at the jump.
        let points = objective.points.borrow();
        let found = state.get_param().and_then(|root| points.iter().find(|point| point.u == root * unit));
        let point = *found.ok_or_else(|| failed("its last value was never tried".to_owned()))?;
        // The secant to the nearest flight that is far against the error bound: local against every curvature.
        let far = (256.0 * resolution).max(0.25 * PREDICTION_WIDTH * point.u);
        let distance = |other: &Point| (other.u - point.u).abs();
        let all_far = points.iter().filter(|other| distance(other) >= far);
        let nearest = all_far.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let slope = nearest.map_or(bracket.slope(), |other| (other.w - point.w) / (other.u - point.u));
        Ok(Some((point, slope)))
    }
}

/// Flights of a root finding that are stored without an allocation; it takes four as a rule.
const FLIGHTS_INLINE: usize = 16;

/// W over u as argmin sees it: both in units near one.
struct Objective<'a, 'b, F> {
    search: &'a Search<'b, F>,
    unit: f64,
    scale: f64,
    /// The ends, known already.
    known: [Point; 2],
    points: RefCell<SmallVec<[Point; FLIGHTS_INLINE]>>,
}

impl<F: Fn(f64) -> Resolved> CostFunction for &Objective<'_, '_, F> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, param: &f64) -> Result<f64, argmin::core::Error> {
        let u = param * self.unit;
        let point = match self.known.iter().find(|point| point.u / self.unit == *param) {
            Some(known) => *known,
            None => self.search.at(u)?,
        };
        self.points.borrow_mut().push(Point { u, ..point });
        Ok(point.w / self.scale)
    }
}

/// A value of V0² (m²/s²) below which the target is not perforated, or a scale of it where there is no such bound.
///
/// - half the static work: the largest of `2/M ∫ (p + s x) dx` up to a stage end or the exit, since drag only takes more;
///   half, since without drag the bound itself is the root, and an end of a bracket must not be;
/// - viscosity alone takes `r L/M` of speed in a length L;
/// - else the drive's own work, and at last the square of the probe's speed.
fn lower_bound(probe: &Problem) -> f64 {
    let (mut work, mut most, mut least, mut viscous) = (0.0, 0.0_f64, 0.0_f64, 0.0);
    for (index, stage) in probe.stages.iter().enumerate() {
        let (from, to) = (probe.start_of(index), probe.limit_of(index));
        if let Some(law) = probe.laws.of(index) {
            let (by_law, most_of_law) = law.static_work(from, to);
            most = most.max(work + most_of_law);
            work += by_law;
        } else {
            work += stage.static_work(from, to);
            viscous += stage.viscosity * (to - from);
        }
        most = most.max(work);
        least = least.min(work);
        if stage.end >= probe.exit_depth {
            break;
        }
    }
    let by_viscosity = viscous / probe.mass;
    let bound = (most / probe.mass).max(0.5 * by_viscosity * by_viscosity);
    if bound > 0.0 {
        bound
    } else if least < 0.0 {
        -2.0 * least / probe.mass
    } else {
        PROBE_SPEED * PROBE_SPEED
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a failed unwrap is a failed test")]
mod tests;
