//! The critical velocity `V_c`: the impact speed at which the projectile just reaches the exit depth.
//!
//! `V_c` is the root of the signed exit energy `W(exit) = margin · V0²` sought against `u = V0²`, by the method of Brent
//! (argmin). Without viscosity W is affine in u (theory section 6), so two flights predict the root and the rest
//! confirm it; the outcome "perforated or not", the depth reached or the residual velocity in its place make Brent's
//! method stop at an end of its bracket or crawl, and what they give is recognised and refused here.
//!
//! `BrentRoot` itself cannot be left alone with an objective. It takes an end value of zero and a product of end
//! values that underflows for a bracket, a NaN for convergence, and its tolerance for an absolute one. So the bracket
//! is found and its signs are checked here, u is measured in units of the predicted root, and the value at the root it
//! returns is compared with the error bar of the flight that gave it.

use std::cell::{OnceCell, RefCell};
use std::fmt::Display;

use argmin::core::{CostFunction, Executor, IterState, State as _, TerminationReason, TerminationStatus};
use argmin::solver::brent::BrentRoot;
use smallvec::SmallVec;
use thiserror::Error;

use crate::integrators::{Cost, IntegrationError, Integrator, Margin, Taylor, keeping};
use crate::physics::{CraterStiffness, Problem, ResolveError, Scene, Shown, Stage, closed_form, exit_energy};

/// Speed [m/s] at which the target is first asked for, to learn its exit depth and static work.
const PROBE_SPEED: f64 = 1.0;

/// Relative half-width in u of the bracket around a predicted root. Wide against round-off and tolerances of 1e-6,
/// narrow enough for one secant step to leave nothing of an affine function's error.
const PREDICTION_WIDTH: f64 = 1.0 / 1_048_576.0;

/// Flights in which the root of an affine W is found and confirmed: the secant, its correction, one beside it.
const AT_ONCE_MAX: u32 = 4;

/// Expansions of the bracket, the factor squared each time: from 4 to beyond the range of the numbers.
const EXPANSIONS_MAX: u32 = 12;

/// Smallest impact speed tried, relative to the first: a target perforated at that has no critical velocity but 0.
const SLOWEST: f64 = 1e-14;

/// Jump of W over u tolerated where a method states no error bar. A scheme that sees the exit at the end of its step
/// leaves far less at any sensible step; an outcome in place of a margin leaves one.
const JUMP_MAX: f64 = 0.1;

/// Share of `V_c` from which an error bar leaves nothing to say.
const UNDECIDED: f64 = 0.5;

/// Where to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Relative tolerance in `V_c`; zero asks for round-off.
    ///
    /// A method that states an error bar is never asked for more than its bar can tell.
    pub rtol: f64,
    /// Most flights before the search counts as failed.
    pub flights_max: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { rtol: 0.0, flights_max: 200 }
    }
}

/// A critical velocity and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalVelocity {
    /// `V_c` [m/s].
    pub velocity: f64,
    /// Half-width of its error bar [m/s]: the bar of W at `V_c` over dW/dV0. `None` where the method states no bar.
    pub error_bar: Option<f64>,
    /// Critical impact energy `E_c` = M `V_c²`/2 [J].
    pub energy: f64,
    /// Flights it took.
    pub evaluations: u32,
    /// Work of all flights.
    pub cost: Cost,
    /// Impact speeds [m/s] with opposite signs of W between which `V_c` was sought at last.
    pub bracket: (f64, f64),
    /// What a reader should know of the result. Empty in the ordinary case.
    pub note: &'static str,
}

/// Impact speed [m/s] and the exit energy W [m²/s²] found there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Impact speed [m/s].
    pub velocity: f64,
    /// Signed exit energy W [m²/s²].
    pub exit_energy: f64,
}

impl Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "W = {} m²/s² at {} m/s", Shown(self.exit_energy), Shown(self.velocity))
    }
}

/// Why there is no critical velocity. `E` is the error of the scene that could not be resolved.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CriticalError<E: Display> {
    /// The target has no far side: a mistake of the caller, exit code 2.
    #[error("a semi-infinite target has no critical velocity: give it a thickness")]
    NoExit,
    /// The search was asked for something impossible: a mistake of the caller, exit code 2.
    #[error("{option} = {} is not allowed: {allowed}", Shown(*.value))]
    BadOption {
        /// Field of [`Options`].
        option: &'static str,
        /// Value given.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The scene has no stages at this impact speed.
    #[error("the scene cannot be resolved at {} m/s: {cause}", Shown(*.velocity))]
    Scene {
        /// Impact speed [m/s].
        velocity: f64,
        /// What the scene says.
        cause: E,
    },
    /// A flight failed.
    #[error("the flight at {} m/s failed: {cause}", Shown(*.velocity))]
    Flight {
        /// Impact speed [m/s].
        velocity: f64,
        /// What the integrator says.
        cause: IntegrationError,
    },
    /// The margin of a flight was no number.
    #[error("the exit energy at {} m/s is {exit_energy}, not a finite number", Shown(*.velocity))]
    NotFinite {
        /// Impact speed [m/s].
        velocity: f64,
        /// The value found [m²/s²].
        exit_energy: f64,
    },
    /// W has the same sign, or is zero, at all speeds up to the largest tried.
    #[error("no critical velocity up to {} m/s: {low}, and still {high}", Shown(.high.velocity))]
    NoBracket {
        /// The slowest flight.
        low: End,
        /// The fastest flight.
        high: End,
    },
    /// W changes sign without a root: it jumps, or is flat on one side.
    #[error(
        "the exit energy changes sign without a root, {at} between {low} and {high}: a step too long for the scene, \
         or an integrator whose margin is not the signed energy"
    )]
    Jump {
        /// Where the search ended.
        at: End,
        /// Lower end of the bracket.
        low: End,
        /// Upper end of the bracket.
        high: End,
    },
    /// The error bar leaves no digit of `V_c`: exit code 4.
    #[error(
        "V_c is undecided: {} m/s with an error bar of {} m/s, the exit energy lost in the error bar of the method",
        Shown(*.velocity), Shown(*.error_bar)
    )]
    Undecided {
        /// Where the search ended [m/s].
        velocity: f64,
        /// Half-width of the error bar there [m/s].
        error_bar: f64,
    },
    /// The tolerance was not reached.
    #[error("tolerance not reached after {flights} flights ({reason}), between {low} and {high}")]
    NotConverged {
        /// Flights flown.
        flights: u32,
        /// What the root finder said.
        reason: String,
        /// Lower end of the bracket.
        low: End,
        /// Upper end of the bracket.
        high: End,
    },
}

impl<E: Display> CriticalError<E> {
    /// Whether the request was at fault (exit code 2) and not the computation (exit code 1).
    ///
    /// A scene that cannot be resolved counts as such.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::NoExit | Self::BadOption { .. } | Self::Scene { .. } => true,
            Self::Flight { cause, .. } => cause.is_usage(),
            _ => false,
        }
    }
}

/// Critical velocity of the target that `resolve` makes of an impact speed.
///
/// `resolve` is asked anew for each speed: with the continuous crater constant the stages depend on V0. The exit depth
/// must not.
///
/// # Returns
/// The root of W(exit) over V0², to the round-off of W or the error bar of the integrator. An exit depth of zero, and a
/// target that is perforated at any speed (it only drives or drags), give `V_c = 0` with a note.
///
/// Flights: four as a rule where W is affine in V0², about twelve where viscosity bends it, up to fifty where the
/// integrator's W jumps.
///
/// # Errors
/// [`CriticalError`]. Each that ends a search shows both ends of the bracket.
pub fn critical_velocity<E: Display>(
    resolve: impl Fn(f64) -> Result<Problem, E>,
    integrator: &dyn Integrator,
    options: Options,
) -> Result<CriticalVelocity, CriticalError<E>> {
    if !(options.rtol >= 0.0 && options.rtol < 0.1) {
        return Err(CriticalError::BadOption {
            option: "rtol",
            value: options.rtol,
            allowed: "zero for round-off, or a number below 0.1",
        });
    }
    let probe = resolve(PROBE_SPEED).map_err(|cause| CriticalError::Scene { velocity: PROBE_SPEED, cause })?;
    if !probe.has_exit() {
        return Err(CriticalError::NoExit);
    }
    if probe.exit_depth <= 0.0 {
        return Ok(at_any_speed(0.0, Some(0.0), Tally::default(), "the target has no thickness"));
    }

    let shooting = Shooting { resolve, integrator, flights_max: options.flights_max, tally: RefCell::default() };
    let Some(bracket) = shooting.bracket(&probe)? else {
        let slowest = shooting.tally.borrow().last.velocity();
        return Ok(at_any_speed(0.0, Some(slowest), shooting.tally.take(), "the target is perforated at any speed"));
    };
    // Of an affine W the secant of any bracket is the root, and a flight beside it confirms that. Where the error bars
    // hide it the method of Brent halves the bracket down, which is short once that is closed in on.
    let affine = probe.stages.iter().all(|stage| stage.viscosity == 0.0);
    let at_once = if affine { shooting.refine(bracket, options.rtol, AT_ONCE_MAX)? } else { None };
    let (bracket, (root, slope)) = if let Some(found) = at_once {
        (bracket, found)
    } else {
        let bracket = shooting.narrow(bracket, affine)?;
        let found = shooting.refine(bracket, options.rtol, options.flights_max)?;
        (bracket, found.ok_or_else(|| shooting.not_converged("the flights allowed are spent".to_owned(), bracket))?)
    };
    let resolution = bracket.resolution(options.rtol);

    let is_root = match root.bar {
        Some(bar) => slope > 0.0 && root.w.abs() <= 2.0 * (bar + slope * resolution),
        None => root.w.abs() <= JUMP_MAX * root.u,
    };
    if !is_root {
        return Err(CriticalError::Jump { at: root.end(), low: bracket.low.end(), high: bracket.high.end() });
    }
    let velocity = root.velocity();
    // dV = du / 2V.
    let error_bar = root.bar.map(|bar| ((bar + root.w.abs()) / slope + resolution) / (2.0 * velocity));
    if let Some(error_bar) = error_bar.filter(|bar| !(*bar < UNDECIDED * velocity)) {
        return Err(CriticalError::Undecided { velocity, error_bar });
    }
    let tally = shooting.tally.take();
    Ok(CriticalVelocity {
        velocity,
        error_bar,
        energy: fault!("critical-energy", 0.5, 1.0) * probe.mass * root.u,
        evaluations: tally.flights,
        cost: tally.cost,
        bracket: (bracket.low.velocity(), bracket.high.velocity()),
        note: "",
    })
}

/// `V_c = 0`, or as good as that.
fn at_any_speed(velocity: f64, error_bar: Option<f64>, tally: Tally, note: &'static str) -> CriticalVelocity {
    CriticalVelocity {
        velocity,
        error_bar,
        energy: 0.0,
        evaluations: tally.flights,
        cost: tally.cost,
        bracket: (0.0, tally.last.velocity()),
        note,
    }
}

/// Critical velocity of `scene` through `integrator`, to round-off or the integrator's error bar.
///
/// # Errors
/// [`CriticalError`].
pub fn of_scene(scene: &Scene, integrator: &dyn Integrator) -> Result<CriticalVelocity, CriticalError<ResolveError>> {
    let first = OnceCell::new();
    let resolve = |speed| match first.get() {
        Some(problem) => scene.resolve_from(problem, speed),
        None => scene.resolve(speed).inspect(|problem| first.set(problem.clone()).unwrap_or(())),
    };
    keeping(integrator, |integrator| critical_velocity(resolve, integrator, Options::default()))
}

/// Exact critical velocity of `scene` [m/s], where it has a closed form.
///
/// # Errors
/// [`closed_form::CriticalError`]: no far side, a viscous stage, or out of range.
pub fn exact(scene: &Scene) -> Result<f64, ExactError> {
    let exit_depth = scene.exit_depth()?;
    let plain = scene.concrete().filter(|c| c.layers.is_empty());
    let critical = match (plain, scene.static_force(), scene.drag()) {
        (Some(concrete), Some(static_force), Some(drag)) => closed_form::critical(
            &closed_form::CraterAndTunnel {
                mass: scene.mass,
                crater_depth: concrete.crater_depth(),
                static_force,
                drag,
                crater_stiffness: concrete.crater_stiffness,
            },
            exit_depth,
        )?,
        // Layers with a continuous crater constant depend on V0 through it.
        _ if scene.concrete().is_some_and(|c| c.crater_stiffness == CraterStiffness::Continuous) => {
            return of_layers(scene, exit_depth);
        }
        _ => closed_form::critical_of_stages(&scene.resolve(PROBE_SPEED)?)?,
    };
    Ok(critical.velocity)
}

/// Exact critical velocity [m/s] of layers behind a continuous crater (theory section 2).
///
/// ```text
/// H <= k d : as in one concrete, that of the layer just beyond k d
/// H >  k d : V1c² backwards from the exit,  V_c² = (V1c² (M + k d Q) + k d P)/M
/// ```
fn of_layers(scene: &Scene, exit_depth: f64) -> Result<f64, ExactError> {
    let mut problem = scene.resolve(PROBE_SPEED)?;
    let Some(crater) = problem.crater else { return Ok(closed_form::critical_of_stages(&problem)?.velocity) };
    let (mass, crater_depth) = (problem.mass, problem.stages[crater].end);
    let Stage { static_force, drag, .. } = problem.stages[crater + 1];
    if exit_depth <= crater_depth {
        let crater_stiffness = CraterStiffness::Continuous;
        let target = closed_form::CraterAndTunnel { mass, crater_depth, static_force, drag, crater_stiffness };
        return Ok(closed_form::critical(&target, exit_depth)?.velocity);
    }
    // A crater without a force hands the demand of the layers through to the face.
    problem.stages[crater].stiffness = 0.0;
    let at_crater_end = closed_form::critical_of_stages(&problem)?.velocity;
    let crater_share = crater_depth / mass;
    Ok((at_crater_end * at_crater_end * (1.0 + crater_share * drag) + crater_share * static_force).sqrt())
}

/// Exact critical velocity of `scene` [m/s], or the one found through the Taylor series to round-off.
///
/// # Errors
/// [`CriticalError`].
pub fn exact_or_refined(scene: &Scene) -> Result<f64, CriticalError<ResolveError>> {
    match exact(scene) {
        Ok(velocity) => Ok(velocity),
        Err(_) => of_scene(scene, &Taylor::default()).map(|found| found.velocity),
    }
}

/// Why a scene has no exact critical velocity.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ExactError {
    /// The scene does not resolve.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// The stages have none.
    #[error(transparent)]
    Closed(#[from] closed_form::CriticalError),
}

/// One flight: `u = V0²`, `W(exit)`, and the bar of W [m²/s²].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Shot {
    u: f64,
    w: f64,
    bar: Option<f64>,
}

impl Shot {
    fn velocity(self) -> f64 {
        self.u.sqrt()
    }

    fn end(self) -> End {
        End { velocity: self.velocity(), exit_energy: self.w }
    }
}

/// Two flights, W < 0 at `low` and W > 0 at `high`, strictly.
#[derive(Clone, Copy, Debug)]
struct Bracket {
    low: Shot,
    high: Shot,
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
    fn with(self, shot: Shot) -> Self {
        if shot.u <= self.low.u || shot.u >= self.high.u || shot.w == 0.0 {
            self
        } else if shot.w < 0.0 {
            Self { low: shot, ..self }
        } else {
            Self { high: shot, ..self }
        }
    }

    /// Half-width in u to which the root is sought: round-off, what was asked for, or a quarter of the error bar.
    ///
    /// The bar at the root lies between those at the ends as the root does: it has a part that grows with u and one
    /// that does not, as W has.
    fn resolution(&self, rtol: f64) -> f64 {
        let root = self.secant_root();
        let share = (root - self.low.u) / (self.high.u - self.low.u);
        let (low, high) = (self.low.bar.unwrap_or(0.0), self.high.bar.unwrap_or(0.0));
        let bar = low + (high - low) * share;
        (2.0 * rtol * root).max(0.25 * bar / self.slope()).max(4.0 * f64::EPSILON * root)
    }
}

/// What was spent.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    flights: u32,
    cost: Cost,
    last: Shot,
}

/// Flights at one target after another impact speed.
struct Shooting<'a, F> {
    resolve: F,
    integrator: &'a dyn Integrator,
    flights_max: u32,
    tally: RefCell<Tally>,
}

impl<F, E> Shooting<'_, F>
where
    F: Fn(f64) -> Result<Problem, E>,
    E: Display,
{
    /// W(exit) at `V0² = u`, a finite number.
    fn shoot(&self, u: f64) -> Result<Shot, CriticalError<E>> {
        let velocity = u.sqrt();
        let mut tally = self.tally.borrow_mut();
        if tally.flights >= self.flights_max {
            let end = tally.last.end();
            return Err(CriticalError::NotConverged {
                flights: tally.flights,
                reason: "the flights allowed are spent".to_owned(),
                low: end,
                high: end,
            });
        }
        let problem = (self.resolve)(velocity).map_err(|cause| CriticalError::Scene { velocity, cause })?;
        let margin = match self.integrator.exit_margin(&problem) {
            // A flight that never ends leaves no target: what it lacks follows from where it is held.
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
        tally.cost += margin.cost;
        let shot = Shot { u, w: margin.value * u, bar: margin.error.map(|error| error * u) };
        if !(u.is_finite() && shot.w.is_finite() && shot.bar.unwrap_or(0.0).is_finite()) {
            return Err(CriticalError::NotFinite { velocity, exit_energy: shot.w });
        }
        tally.last = shot;
        Ok(shot)
    }

    /// Two flights with strictly opposite signs; `None` when the target is perforated however slow the projectile.
    fn bracket(&self, probe: &Problem) -> Result<Option<Bracket>, CriticalError<E>> {
        let first = self.shoot(lower_bound(probe))?;
        let (mut low, mut high) = (first, first);
        let mut factor = 4.0_f64;
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
                low = self.shoot((low.u / factor).max(slowest))?;
                factor *= factor;
            }
        } else {
            for expansion in 0.. {
                let before = high;
                // Where two stops show how W rises, their line tells where it is zero: go twice as far above it.
                let line = if expansion == 0 { f64::NAN } else { Bracket { low, high }.secant_root() };
                let next = if line > high.u && line < 1e12 * high.u { 2.0 * line - high.u } else { high.u * factor };
                if expansion == EXPANSIONS_MAX || !next.is_finite() {
                    return Err(CriticalError::NoBracket { low: first.end(), high: high.end() });
                }
                high = self.shoot(next)?;
                if high.w > 0.0 {
                    low = if before.w < 0.0 { before } else { low };
                    break;
                }
                low = before;
                factor *= factor;
            }
        }
        if low.w < 0.0 && high.w > 0.0 {
            Ok(Some(Bracket { low, high }))
        } else {
            Err(CriticalError::NoBracket { low: low.end(), high: high.end() })
        }
    }

    /// A bracket close around the root that the secant predicts, where W is affine enough for that to hold.
    fn narrow(&self, wide: Bracket, affine: bool) -> Result<Bracket, CriticalError<E>> {
        if !affine {
            return Ok(wide);
        }
        let root = wide.secant_root();
        // The bracket must be wide against the error bars at its ends, else their signs mean nothing.
        let bar = 64.0 * wide.resolution(0.0) / root;
        let width = PREDICTION_WIDTH.max(bar);
        if width > 0.1 {
            return Ok(wide);
        }
        let above = self.shoot(root * (1.0 + width))?;
        let narrower = wide.with(above);
        if above.w <= 0.0 {
            return Ok(narrower);
        }
        Ok(narrower.with(self.shoot(root * (1.0 - width))?))
    }

    fn not_converged(&self, reason: String, bracket: Bracket) -> CriticalError<E> {
        let flights = self.tally.borrow().flights;
        CriticalError::NotConverged { flights, reason, low: bracket.low.end(), high: bracket.high.end() }
    }

    /// The flight at the root within a bracket, by the method of Brent, and dW/du there; `None` when `flights_max` more
    /// flights do not tell it.
    fn refine(&self, bracket: Bracket, rtol: f64, flights_max: u32) -> Result<Option<(Shot, f64)>, CriticalError<E>> {
        let resolution = bracket.resolution(rtol);
        let unit = bracket.secant_root();
        let objective = Objective {
            shooting: self,
            unit,
            scale: bracket.low.w.abs().max(bracket.high.w),
            known: [bracket.low, bracket.high],
            flown: RefCell::default(),
            failure: RefCell::new(None),
        };
        // The solver stops at a half-width of 2 eps |b| + tol/2.
        let tolerance = 2.0 * resolution / unit - 4.0 * f64::EPSILON;
        let solver = BrentRoot::new(bracket.low.u / unit, bracket.high.u / unit, tolerance.max(0.0));
        // The iteration that sees the end flies no more.
        let iterations = u64::from(flights_max) + 1;
        let run = Executor::new(&objective, solver)
            .configure(|state: IterState<f64, (), (), (), (), f64>| state.max_iters(iterations))
            .ctrlc(false)
            .timer(false)
            .run();
        let failed = |reason: String| self.not_converged(reason, bracket);
        if let Some(failure) = objective.failure.take() {
            return Err(match failure {
                CriticalError::NotConverged { reason, .. } => failed(reason),
                other => other,
            });
        }
        let state = run.map_err(|error| failed(error.to_string()))?.state;
        match state.get_termination_status() {
            TerminationStatus::Terminated(TerminationReason::SolverConverged) => {}
            TerminationStatus::Terminated(TerminationReason::MaxItersReached) => return Ok(None),
            other => return Err(failed(other.to_string())),
        }
        // The last value and not the best one, which is the same for a root: where W jumps the best may be the first
        // flight that landed on the lower tread, while the last stands at the jump.
        let Some(&root) = state.get_param() else {
            return Err(failed("no value".to_owned()));
        };
        let flown = objective.flown.borrow();
        let Some(&shot) = flown.iter().find(|shot| shot.u == root * unit) else {
            return Err(failed(format!("{root} was never flown")));
        };
        // The secant to the nearest flight that is far against the error bar: local against every curvature.
        let far = (256.0 * resolution).max(0.25 * PREDICTION_WIDTH * shot.u);
        let mut slope = bracket.slope();
        let mut nearest = f64::INFINITY;
        for other in flown.iter() {
            let distance = (other.u - shot.u).abs();
            if distance >= far && distance < nearest {
                nearest = distance;
                slope = (other.w - shot.w) / (other.u - shot.u);
            }
        }
        Ok(Some((shot, slope)))
    }
}

/// Flights of a root finding that are remembered without an allocation; it takes four as a rule.
const FLIGHTS_INLINE: usize = 16;

/// W over u as argmin sees it: both in units near one.
struct Objective<'a, 'b, F, E: Display> {
    shooting: &'a Shooting<'b, F>,
    unit: f64,
    scale: f64,
    /// The ends, flown already.
    known: [Shot; 2],
    flown: RefCell<SmallVec<[Shot; FLIGHTS_INLINE]>>,
    failure: RefCell<Option<CriticalError<E>>>,
}

impl<F, E> CostFunction for &Objective<'_, '_, F, E>
where
    F: Fn(f64) -> Result<Problem, E>,
    E: Display,
{
    type Param = f64;
    type Output = f64;

    fn cost(&self, param: &f64) -> Result<f64, argmin::core::Error> {
        let u = param * self.unit;
        let shot = match self.known.iter().find(|shot| shot.u / self.unit == *param) {
            Some(known) => *known,
            None => match self.shooting.shoot(u) {
                Ok(shot) => shot,
                Err(error) => {
                    let message = error.to_string();
                    *self.failure.borrow_mut() = Some(error);
                    return Err(argmin::core::Error::msg(message));
                }
            },
        };
        self.flown.borrow_mut().push(Shot { u, ..shot });
        Ok(shot.w / self.scale)
    }
}

/// A value of V0² [m²/s²] below which the target is not perforated, or a scale of it where there is no such bound.
///
/// - half the static work: the largest of `2/M ∫ (p + s x) dx` up to a stage end or the exit, since drag only takes more;
///   half, since without drag the bound itself is the root, and an end of a bracket must not be;
/// - viscosity alone takes `r L/M` of speed in a length L;
/// - else the drive's own work, and at last the square of the probe's speed.
fn lower_bound(probe: &Problem) -> f64 {
    let (mut work, mut most, mut least, mut viscous) = (0.0, 0.0_f64, 0.0_f64, 0.0);
    for (index, stage) in probe.stages.iter().enumerate() {
        let (from, to) = (probe.start_of(index), probe.limit_of(index));
        work += stage.static_work(from, to);
        viscous += stage.viscosity * (to - from);
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
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::integrators::{Detail, Energy, Flight, Margin};
    use crate::physics::exit_energy::expm1_over;
    use crate::physics::{Stage, Stages, Target};

    /// Crater and tunnel: mass, k d, P, Q, c if given, H.
    #[derive(Clone, Copy, Debug)]
    struct Slab {
        mass: f64,
        kd: f64,
        p: f64,
        q: f64,
        c: Option<f64>,
        h: f64,
    }

    const SLAB: Slab = Slab { mass: 2.0, kd: 0.1, p: 848_230.0, q: 3.25, c: None, h: 0.4 };

    impl Slab {
        #[expect(clippy::unnecessary_wraps, reason = "it stands for a scene, which may refuse")]
        fn at(self, v0: f64) -> Result<Problem, Infallible> {
            let Self { mass, kd, p, q, c, h } = self;
            let c = c.unwrap_or(mass * (p + q * v0 * v0) / (kd * (mass + kd * q)));
            Ok(Problem {
                mass,
                impact_speed: v0,
                exit_depth: h,
                stages: Stages::from_slice(&[Stage::crater(c, kd), Stage::tunnel(p, q)]),
                crater: Some(0),
                target: Target::CraterAndTunnel,
            })
        }

        /// Theory section 2.
        fn critical(self) -> f64 {
            let Self { mass, kd, p, q, c, h } = self;
            if h <= kd {
                let squared = match c {
                    Some(c) => c * h * h / mass,
                    None => h * h * p / (kd * mass + q * (kd - h) * (kd + h)),
                };
                return squared.sqrt();
            }
            let v1 = 2.0 * p * (h - kd) / mass * expm1_over(2.0 * q * (h - kd) / mass);
            let squared = match c {
                Some(c) => v1 + c * kd * kd / mass,
                None => (v1 * (mass + kd * q) + kd * p) / mass,
            };
            squared.sqrt()
        }
    }

    fn stages_at(stages: &[Stage], exit: f64) -> impl Fn(f64) -> Result<Problem, Infallible> {
        move |v0| {
            Ok(Problem {
                mass: 1.0,
                impact_speed: v0,
                exit_depth: exit,
                stages: Stages::from_slice(stages),
                crater: None,
                target: Target::Stages,
            })
        }
    }

    fn constant(p: f64, q: f64, end: f64) -> Stage {
        Stage { end, ..Stage::tunnel(p, q) }
    }

    /// An integrator that only knows a margin.
    struct Oracle<F>(F);

    impl<F: Fn(&Problem) -> (f64, Option<f64>)> Integrator for Oracle<F> {
        fn name(&self) -> &'static str {
            "oracle"
        }

        fn fly(&self, _: &Problem, _: Detail) -> Result<Flight, IntegrationError> {
            Err(IntegrationError::Refused { method: "oracle", why: "it knows the margin only".to_owned() })
        }

        fn exit_margin(&self, problem: &Problem) -> Result<Option<Margin>, IntegrationError> {
            let (value, error) = (self.0)(problem);
            Ok(Some(Margin { value, error, cost: Cost::default() }))
        }
    }

    fn search(slab: Slab, integrator: &dyn Integrator) -> Result<CriticalVelocity, CriticalError<Infallible>> {
        critical_velocity(|v0| slab.at(v0), integrator, Options::default())
    }

    /// True margin of the slab, affine in V0².
    fn true_margin(problem: &Problem) -> f64 {
        Energy::new().exit_margin_in(problem).unwrap().unwrap().0
    }

    #[test]
    fn critical_velocity_agrees_with_the_closed_form_within_its_bar_and_twelve_flights() {
        let (mut worst, mut flights, mut share) = (0.0_f64, 0, 0.0_f64);
        let mut cases = 0;
        for h in [1e-3, 0.05, 0.1, 0.1 + 1e-9, 0.15, 0.4, 1.0, 3.0, 10.0] {
            for q in [0.0, 1e-6, 0.3, 3.25, 20.0] {
                for c in [None, Some(4e6), Some(2e7)] {
                    for mass in [0.1, 2.0, 500.0] {
                        let slab = Slab { mass, q, c, h, ..SLAB };
                        if 2.0 * q * h / mass > 600.0 {
                            continue;
                        }
                        let found = search(slab, &Energy::new()).unwrap_or_else(|e| panic!("{slab:?}: {e}"));
                        let exact = slab.critical();
                        let error = (found.velocity - exact).abs();
                        // The drag exponent y = 2 q h/M is a condition number of V_c² once it is above one.
                        let condition = (2.0 * q * h / mass).max(1.0);
                        // The closed form has its own few ulp.
                        let bar = found.error_bar.unwrap() + 4.0 * f64::EPSILON * condition * exact;
                        assert!(error <= bar, "{slab:?}: {error:e} over {bar:e}");
                        worst = worst.max(error / exact / condition);
                        share = share.max(found.error_bar.unwrap() / exact / condition);
                        // Beyond, V_c is e^50 times the speed that the static work alone would ask for.
                        if condition < 100.0 {
                            flights = flights.max(found.evaluations);
                        }
                        assert!(found.evaluations <= 16, "{slab:?}");
                        cases += 1;
                        assert!((found.energy / (0.5 * mass * found.velocity.powi(2)) - 1.0).abs() < 1e-15, "{slab:?}");
                    }
                }
            }
        }
        println!("{cases} cases: worst error {worst:e}, largest bar {share:e}, most flights {flights}");
        assert!(worst < 1e-13 && share < 1e-13 && flights <= 12);
    }

    #[test]
    fn a_slab_that_takes_nearly_all_of_v0_is_searched_in_time_or_over_depth() {
        // e^y times the static work per mass is V_c², e^130 of it at last.
        for h in [12.0, 20.0, 40.0] {
            let slab = Slab { h, ..SLAB };
            let (exact, drag) = (slab.critical(), 2.0 * slab.q * h / slab.mass);
            assert!(drag > 38.0);
            let integrators: [&dyn Integrator; 2] = [&Energy::new(), &Taylor::default()];
            for integrator in integrators {
                let found = search(slab, integrator).unwrap();
                assert!((found.velocity / exact - 1.0).abs() < 1e-15 * drag, "{found:?} and not {exact}");
                assert!((found.velocity - exact).abs() < found.error_bar.unwrap(), "{found:?} and not {exact}");
            }
        }
    }

    #[test]
    fn an_error_bar_that_leaves_no_digit_is_undecided_and_not_a_number() {
        // A bar of some ulp of V0², where the drag takes 1e17 of that.
        let slab = Slab { h: 12.0, ..SLAB };
        let coarse = Oracle(|problem: &Problem| (true_margin(problem), Some(1e-15)));
        let refusal = search(slab, &coarse).unwrap_err();
        let CriticalError::Undecided { velocity, error_bar } = refusal else { panic!("{refusal}") };
        assert!(2.0 * error_bar >= velocity, "{velocity} {error_bar}");
    }

    /// Layers of F = r V in front of a static one, behind one, and alone: by hand from dV/dx = -r/M.
    #[test]
    fn layers_that_only_slow_have_a_critical_velocity_though_slower_flights_never_end() {
        let slowing = |end| Stage { viscosity: 1.0, end, ..Stage::tunnel(0.0, 0.0) };
        let resisting = |force, end| Stage { end, ..Stage::tunnel(force, 0.0) };
        for (stages, exact) in [
            (vec![slowing(0.5), resisting(0.1, f64::INFINITY)], 0.5 + 0.1_f64.sqrt()),
            (vec![resisting(1.0, 0.5), slowing(f64::INFINITY)], 1.25_f64.sqrt()),
            (vec![slowing(f64::INFINITY)], 1.0),
        ] {
            let at = |impact_speed| {
                let stages = Stages::from_slice(&stages);
                let target = Target::Stages;
                Ok::<_, Infallible>(Problem { mass: 1.0, impact_speed, exit_depth: 1.0, stages, crater: None, target })
            };
            for integrator in [&Taylor::default() as &dyn Integrator, &crate::integrators::ClosedForm] {
                let found = critical_velocity(at, integrator, Options::default()).unwrap();
                let (error, bar) = ((found.velocity - exact).abs(), found.error_bar.unwrap());
                assert!(error <= bar && error < 1e-14, "{} {stages:?}: {found:?} and not {exact}", integrator.name());
            }
        }
    }

    #[test]
    fn usual_slab_takes_four_flights() {
        let found = search(SLAB, &Energy::new()).unwrap();
        assert_eq!(found.evaluations, 4);
        assert_eq!(found.note, "");
        assert!(found.bracket.0 < found.velocity && found.velocity < found.bracket.1);
        assert!(found.cost.force_evaluations > 0);
    }

    /// A looser method has a wider bar, which holds, and takes no more flights than the bar is worth.
    #[test]
    fn bar_of_a_loose_method_holds() {
        let exact = SLAB.critical();
        for rtol in [1e-12, 1e-9, 1e-6, 1e-4, 1e-2] {
            let found = search(SLAB, &Energy::with_rtol(rtol).unwrap()).unwrap();
            let (error, bar) = ((found.velocity - exact).abs(), found.error_bar.unwrap());
            println!("{rtol:e}: {error:e} {bar:e} {}", found.evaluations);
            assert!(error <= bar, "rtol {rtol:e}: {error:e} over {bar:e}");
            assert!(bar < 10.0 * rtol * exact + 1e-12, "rtol {rtol:e}: bar {bar:e}");
            assert!(found.evaluations <= 12);
        }
    }

    #[test]
    fn tolerance_asked_for_is_kept_and_saves_flights() {
        // Bent, so that the root finder has something to save.
        let bent = Oracle(|problem: &Problem| {
            let u = problem.impact_speed.powi(2);
            ((u - 1e5 - 100.0 * u.sqrt()) / u, Some(1e-16))
        });
        let exact = 50.0 + (2500.0_f64 + 1e5).sqrt();
        let viscous = |v0| {
            let mut problem = SLAB.at(v0)?;
            problem.stages[1].viscosity = 1.0;
            Ok::<_, Infallible>(problem)
        };
        let fine = critical_velocity(viscous, &bent, Options::default()).unwrap();
        assert!((fine.velocity / exact - 1.0).abs() < 1e-15, "{fine:?}");
        assert!(fine.evaluations <= 15, "{}", fine.evaluations);
        let coarse = critical_velocity(viscous, &bent, Options { rtol: 1e-4, ..Options::default() }).unwrap();
        assert!((coarse.velocity - exact).abs() <= coarse.error_bar.unwrap());
        assert!((coarse.velocity / exact - 1.0).abs() < 1e-4 && coarse.evaluations < fine.evaluations);
        for rtol in [-1.0, f64::NAN, 1.0] {
            let refusal = critical_velocity(viscous, &bent, Options { rtol, ..Options::default() }).unwrap_err();
            assert!(refusal.is_usage(), "{refusal}");
        }
    }

    /// Findings 4 and 5 of the survey: these objectives made `BrentRoot` "converge" at an end of its bracket.
    #[test]
    fn outcome_as_objective_is_refused() {
        for bar in [None, Some(1e-15)] {
            let boolean = Oracle(|problem: &Problem| (true_margin(problem).signum(), bar));
            let refusal = search(SLAB, &boolean).unwrap_err();
            assert!(matches!(refusal, CriticalError::Jump { .. }), "{refusal}");
            assert!(!refusal.is_usage());
        }
    }

    #[test]
    fn depth_capped_at_the_exit_as_objective_is_refused() {
        for bar in [None, Some(1e-15)] {
            let capped = Oracle(|problem: &Problem| (true_margin(problem).min(0.0), bar));
            let refusal = search(SLAB, &capped).unwrap_err();
            let CriticalError::NoBracket { low, high } = refusal else { panic!("{refusal}") };
            assert!(low.exit_energy < 0.0 && high.exit_energy == 0.0);
            assert!(refusal.to_string().contains(&low.to_string()) && refusal.to_string().contains(&high.to_string()));
        }
    }

    /// The residual energy that is zero for every stop: the mirror image of the capped depth.
    #[test]
    fn residual_energy_without_a_sign_as_objective_is_refused() {
        for bar in [None, Some(1e-15)] {
            let residual = Oracle(|problem: &Problem| (true_margin(problem).max(0.0), bar));
            let refusal = search(SLAB, &residual).unwrap_err();
            let CriticalError::NoBracket { low, high } = refusal else { panic!("{refusal}") };
            assert!(low.exit_energy == 0.0 && high.exit_energy > 0.0);
        }
    }

    /// Noise within the bar, different at every speed, as adaptive steps make it.
    #[test]
    fn noise_within_the_bar_costs_neither_flights_nor_truth() {
        for noise in [1e-12, 1e-9, 1e-6, 1e-3] {
            let noisy = Oracle(|problem: &Problem| {
                let wave = (problem.impact_speed * 1e9).sin();
                (true_margin(problem) + noise * wave, Some(noise))
            });
            let found = search(SLAB, &noisy).unwrap();
            let (error, bar) = ((found.velocity - SLAB.critical()).abs(), found.error_bar.unwrap());
            assert!(error <= bar, "{noise:e}: {error:e} over {bar:e}");
            assert!(bar < 10.0 * noise * found.velocity && found.evaluations <= 12, "{noise:e}: {found:?}");
        }
    }

    /// The residual velocity with its sign has an infinite slope at `V_c`. Its zero is right, and so accepted.
    #[test]
    fn root_of_a_margin_with_an_infinite_slope_is_found() {
        let root = Oracle(|problem: &Problem| {
            let margin = true_margin(problem);
            (margin.abs().sqrt().copysign(margin), None)
        });
        let found = search(SLAB, &root).unwrap();
        assert!((found.velocity / SLAB.critical() - 1.0).abs() < 1e-13);
        assert_eq!(found.error_bar, None);
    }

    /// A scheme that sees the exit at a step's end: W is a staircase over V0. Its sign change is still located, and no
    /// bar is invented.
    #[test]
    fn sign_change_of_a_staircase_is_located() {
        let staircase = Oracle(|problem: &Problem| {
            let u = problem.impact_speed.powi(2);
            (((true_margin(problem) * u / 300.0).floor() * 300.0 + 40.0) / u, None)
        });
        let found = search(SLAB, &staircase).unwrap();
        // The floor changes sign at W = 0.
        assert!((found.velocity / SLAB.critical() - 1.0).abs() < 1e-12, "{} {}", found.velocity, SLAB.critical());
        assert_eq!(found.error_bar, None);
        assert!(found.evaluations < 80, "{}", found.evaluations);
    }

    #[test]
    fn nan_is_an_error_wherever_it_comes() {
        let always = Oracle(|_: &Problem| (f64::NAN, None));
        assert!(matches!(search(SLAB, &always), Err(CriticalError::NotFinite { .. })));
        let exact = SLAB.critical();
        // Within the bracket only, where argmin would call it convergence.
        let inside = Oracle(|problem: &Problem| {
            let near = (problem.impact_speed / exact - 1.0).abs() < 1e-8;
            (if near { f64::NAN } else { true_margin(problem) }, None)
        });
        let refusal = search(SLAB, &inside).unwrap_err();
        assert!(matches!(refusal, CriticalError::NotFinite { velocity, .. } if (velocity / exact - 1.0).abs() < 1e-8));
    }

    #[test]
    fn margin_of_one_sign_shows_both_ends() {
        let never = Oracle(|_: &Problem| (-0.5, None));
        let refusal = search(SLAB, &never).unwrap_err();
        let CriticalError::NoBracket { low, high } = refusal else { panic!("{refusal}") };
        assert!(low.velocity < high.velocity && low.exit_energy < 0.0 && high.exit_energy < 0.0);
        // The slab of a kilometre: e^y leaves the range of the numbers.
        let refusal = search(Slab { h: 1000.0, ..SLAB }, &Energy::new()).unwrap_err();
        assert!(!refusal.is_usage() && refusal.to_string().contains("no critical velocity up to"), "{refusal}");
    }

    #[test]
    fn flights_are_bounded() {
        let options = Options { flights_max: 3, ..Options::default() };
        let refusal = critical_velocity(|v0| SLAB.at(v0), &Energy::new(), options).unwrap_err();
        assert!(matches!(refusal, CriticalError::NotConverged { flights: 3, .. }), "{refusal}");
    }

    #[test]
    fn semi_infinite_target_is_a_mistake_of_the_caller() {
        let refusal = search(Slab { h: f64::INFINITY, ..SLAB }, &Energy::new()).unwrap_err();
        assert_eq!(refusal, CriticalError::NoExit);
        assert!(refusal.is_usage());
    }

    #[test]
    fn target_without_thickness_takes_no_flight() {
        let found = search(Slab { h: 0.0, ..SLAB }, &Energy::new()).unwrap();
        assert_eq!((found.velocity, found.energy, found.evaluations, found.error_bar), (0.0, 0.0, 0, Some(0.0)));
        assert!(!found.note.is_empty());
    }

    #[test]
    fn errors_of_scene_and_flight_come_through() {
        let refusal = critical_velocity(|_| Err("no such scene"), &Energy::new(), Options::default()).unwrap_err();
        assert!(refusal.is_usage() && refusal.to_string().contains("no such scene"), "{refusal}");
        let viscous = |v0| {
            let mut problem = SLAB.at(v0)?;
            problem.stages[1].viscosity = 1.0;
            Ok::<_, Infallible>(problem)
        };
        let refusal = critical_velocity(viscous, &Energy::new(), Options::default()).unwrap_err();
        assert!(refusal.is_usage() && matches!(refusal, CriticalError::Flight { .. }), "{refusal}");
    }

    #[test]
    fn target_that_only_drives_or_drags_is_perforated_at_any_speed() {
        let end = f64::INFINITY;
        for stages in [vec![constant(-10.0, 0.0, end)], vec![constant(-10.0, 2.0, end)], vec![constant(0.0, 2.0, end)]]
        {
            let found = critical_velocity(stages_at(&stages, 2.0), &Energy::new(), Options::default()).unwrap();
            assert_eq!((found.velocity, found.energy), (0.0, 0.0), "{stages:?}");
            assert!(found.error_bar.unwrap() < 1e-12 && !found.note.is_empty(), "{found:?}");
        }
    }

    /// A drive before a barrier lowers `V_c`, a drive behind it does not; one that outdoes the barrier leaves none.
    #[test]
    fn barrier_decides_the_critical_velocity_of_a_driven_target() {
        let search = |stages: &[Stage]| critical_velocity(stages_at(stages, 3.0), &Energy::new(), Options::default());
        let (drive, barrier) = (constant(-4.0, 0.0, 1.0), constant(10.0, 0.0, 2.0));
        let found = search(&[drive, barrier, constant(-100.0, 0.0, f64::INFINITY)]).unwrap();
        assert!((found.velocity - 12.0_f64.sqrt()).abs() < 1e-14, "{found:?}");
        assert!(found.evaluations <= 12);
        let strong = constant(-20.0, 0.0, 1.0);
        let found = search(&[strong, barrier, constant(0.0, 0.0, f64::INFINITY)]).unwrap();
        assert_eq!(found.velocity, 0.0);
    }
}
