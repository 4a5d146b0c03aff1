//! The critical velocity V_c: the impact speed at which the projectile just reaches the exit depth.
//!
//! V_c is the root of the signed exit energy `W(exit) = margin · V0²` sought against `u = V0²`, by the method of Brent
//! (argmin). Without viscosity W is affine in u (theory section 6), so two flights predict the root and the rest
//! confirm it; the outcome "perforated or not", the depth reached or the residual velocity in its place make Brent's
//! method stop at an end of its bracket or crawl, and what they give is recognised and refused here.
//!
//! `BrentRoot` itself cannot be left alone with an objective. It takes an end value of zero and a product of end
//! values that underflows for a bracket, a NaN for convergence, and its tolerance for an absolute one. So the bracket
//! is found and its signs are checked here, u is measured in units of the predicted root, and the value at the root it
//! returns is compared with the error bar of the flight that gave it.

use std::cell::RefCell;
use std::fmt::Display;

use argmin::core::{CostFunction, Executor, IterState, State as _, TerminationReason, TerminationStatus};
use argmin::solver::brent::BrentRoot;
use thiserror::Error;

use crate::integrators::{Cost, IntegrationError, Integrator};
use crate::physics::Problem;

/// Speed [m/s] at which the target is first asked for, to learn its exit depth and static work.
const PROBE_SPEED: f64 = 1.0;

/// Relative half-width in u of the bracket around a predicted root. Wide against round-off and tolerances of 1e-6,
/// narrow enough for one secant step to leave nothing of an affine function's error.
const PREDICTION_WIDTH: f64 = 1.0 / 1_048_576.0;

/// Expansions of the bracket, the factor squared each time: from 4 to beyond the range of the numbers.
const EXPANSIONS_MAX: u32 = 12;

/// Smallest impact speed tried, relative to the first: a target perforated at that has no critical velocity but 0.
const SLOWEST: f64 = 1e-14;

/// Jump of W over u tolerated where a method states no error bar. A scheme that sees the exit at the end of its step
/// leaves far less at any sensible step; an outcome in place of a margin leaves one.
const JUMP_MAX: f64 = 0.1;

/// Where to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Relative tolerance in V_c; zero asks for round-off.
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
    /// V_c [m/s].
    pub velocity: f64,
    /// Half-width of its error bar [m/s]: the bar of W at V_c over dW/dV0. `None` where the method states no bar.
    pub error_bar: Option<f64>,
    /// Critical impact energy E_c = M V_c²/2 [J].
    pub energy: f64,
    /// Flights it took.
    pub evaluations: u32,
    /// Work of all flights.
    pub cost: Cost,
    /// Impact speeds [m/s] with opposite signs of W between which V_c was sought at last.
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
        write!(f, "W = {} m²/s² at {} m/s", self.exit_energy, self.velocity)
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
    #[error("{option} = {value} is not allowed: {allowed}")]
    BadOption {
        /// Field of [`Options`].
        option: &'static str,
        /// Value given.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The scene has no stages at this impact speed.
    #[error("the scene cannot be resolved at {velocity} m/s: {cause}")]
    Scene {
        /// Impact speed [m/s].
        velocity: f64,
        /// What the scene says.
        cause: E,
    },
    /// A flight failed.
    #[error("the flight at {velocity} m/s failed: {cause}")]
    Flight {
        /// Impact speed [m/s].
        velocity: f64,
        /// What the integrator says.
        cause: IntegrationError,
    },
    /// The margin of a flight was no number.
    #[error("the exit energy at {velocity} m/s is {exit_energy}, not a finite number")]
    NotFinite {
        /// Impact speed [m/s].
        velocity: f64,
        /// The value found [m²/s²].
        exit_energy: f64,
    },
    /// W has the same sign, or is zero, at all speeds up to the largest tried.
    #[error("no finite critical velocity: {low}, and still {high}")]
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
/// Flights: seven as a rule where W is affine in V0², about twelve where viscosity bends it, up to fifty where the
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
    let probe =
        resolve(PROBE_SPEED).map_err(|cause| CriticalError::Scene { velocity: PROBE_SPEED, cause })?;
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
    let affine = probe.stages.iter().all(|stage| stage.viscosity == 0.0);
    let bracket = shooting.narrow(bracket, affine)?;
    let root = shooting.refine(bracket, options.rtol)?;

    // dW/du by the secant of the bracket, which is narrow against every curvature and wide against every error bar.
    let slope = bracket.slope();
    let jump = match root.bar {
        Some(bar) => 2.0 * (bar + slope * bracket.resolution(options.rtol, slope)),
        None => JUMP_MAX * root.u,
    };
    if !(root.w.abs() <= jump && slope > 0.0) {
        return Err(CriticalError::Jump { at: root.end(), low: bracket.low.end(), high: bracket.high.end() });
    }
    let velocity = root.velocity();
    let tally = shooting.tally.take();
    Ok(CriticalVelocity {
        velocity,
        error_bar: root.bar.map(|bar| {
            let width = (bar + root.w.abs()) / slope + bracket.resolution(options.rtol, slope);
            0.5 * width / velocity
        }),
        energy: 0.5 * probe.mass * root.u,
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
    fn resolution(&self, rtol: f64, slope: f64) -> f64 {
        let bar = self.low.bar.unwrap_or(0.0).max(self.high.bar.unwrap_or(0.0));
        (2.0 * rtol * self.high.u).max(0.25 * bar / slope).max(4.0 * f64::EPSILON * self.high.u)
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
        let margin =
            self.integrator.exit_margin(&problem).map_err(|cause| CriticalError::Flight { velocity, cause })?;
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
                high = low;
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
        let bar = 64.0 * wide.resolution(0.0, wide.slope()) / root;
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

    /// The root within a bracket, by the method of Brent.
    fn refine(&self, bracket: Bracket, rtol: f64) -> Result<Shot, CriticalError<E>> {
        let unit = bracket.high.u;
        let slope = bracket.slope();
        let objective = Objective {
            shooting: self,
            unit,
            scale: bracket.low.w.abs().max(bracket.high.w),
            known: [bracket.low, bracket.high],
            best: RefCell::new(Vec::with_capacity(16)),
            failure: RefCell::new(None),
        };
        // The solver stops at a half-width of 2 eps |b| + tol/2.
        let tolerance = 2.0 * bracket.resolution(rtol, slope) / unit - 4.0 * f64::EPSILON;
        let solver = BrentRoot::new(bracket.low.u / unit, 1.0, tolerance.max(0.0));
        let flights_max = u64::from(self.flights_max);
        let run = Executor::new(&objective, solver)
            .configure(|state: IterState<f64, (), (), (), (), f64>| state.max_iters(flights_max))
            .ctrlc(false)
            .timer(false)
            .run();
        let failed = |reason: String| CriticalError::NotConverged {
            flights: self.tally.borrow().flights,
            reason,
            low: bracket.low.end(),
            high: bracket.high.end(),
        };
        if let Some(failure) = objective.failure.take() {
            return Err(match failure {
                CriticalError::NotConverged { reason, .. } => failed(reason),
                other => other,
            });
        }
        let state = run.map_err(|error| failed(error.to_string()))?.state;
        if *state.get_termination_status() != TerminationStatus::Terminated(TerminationReason::SolverConverged) {
            return Err(failed(state.get_termination_status().to_string()));
        }
        let Some(&root) = state.get_best_param() else {
            return Err(failed("no best value".to_owned()));
        };
        let shots = objective.best.borrow();
        let shot = shots.iter().chain(&objective.known).find(|shot| shot.u == root * unit);
        shot.copied().ok_or_else(|| failed(format!("{root} was never flown")))
    }
}

/// W over u as argmin sees it: both in units near one.
struct Objective<'a, 'b, F, E: Display> {
    shooting: &'a Shooting<'b, F>,
    unit: f64,
    scale: f64,
    /// The ends, flown already.
    known: [Shot; 2],
    best: RefCell<Vec<Shot>>,
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
        self.best.borrow_mut().push(Shot { u, ..shot });
        Ok(shot.w / self.scale)
    }
}

/// A value of V0² [m²/s²] below which the target is not perforated, or a scale of it where there is no such bound.
///
/// - static work: the largest of `2/M ∫ (p + s x) dx` up to a stage end or the exit, since drag only takes more;
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
    let bound = (2.0 * most / probe.mass).max(by_viscosity * by_viscosity);
    if bound > 0.0 {
        bound
    } else if least < 0.0 {
        -2.0 * least / probe.mass
    } else {
        PROBE_SPEED * PROBE_SPEED
    }
}
