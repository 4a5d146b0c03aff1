//! The method `energy`: kinetic energy over depth, then time over whichever variable is regular there.
//!
//! With `w = V²/V0²` and depth as the independent variable the equation of motion without viscosity is linear,
//!
//! ```text
//! dw/dx = -(a + b x + κ w),   a = 2p/(M V0²),  b = 2s/(M V0²),  κ = 2q/M,   w(0) = 1
//! ```
//!
//! and smooth through `w < 0`. Stage ends and the exit depth are then fixed stops, rest is a transversal root of w, and
//! the exit margin is w(exit) itself: nothing grazes where x(t) does (theory section 6). Each step sums the Taylor
//! series of w in x, whose coefficients follow from the equation, to as many terms as the tolerance needs; where
//! `q = 0` the series ends by itself. The stage's own formula, [`crate::physics::exit_energy::carry`], is not used.
//!
//! The time `t̂ = V0 t` [m] comes after the depth and the speed at both ends of a leg are known. Its two forms
//!
//! ```text
//! dt̂/dx = w^(-1/2)                           singular at rest
//! dt̂/dv = -2/f,  dx/dv = -2v/f,  v = √w      regular at rest, singular at f = a + b x + κ v² = 0 (impact on a crater)
//! ```
//!
//! fail at opposite ends, and every step takes the one whose singularity is farther away, measured in what is left.
//!
//! A viscous stage (`r > 0`) brings √w into the first equation, which is then neither linear nor smooth at rest; it is
//! refused.

use super::outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Margin, Sample};
use crate::physics::{Event, EventKind, Outcome, Problem, Scalar, Stage, State};

/// Name of the method in the contract.
const NAME: &str = "energy";

/// Longest step in units of the drag length 1/κ. The series of w alternates like that of `exp(-κ h)`: at 1 the
/// largest term is 2.7 times the sum, so no digit is lost, and 18 terms reach the round-off of `f64`.
const DRAG_LENGTHS_MAX: f64 = 1.0;

/// Bound on the terms of w in a step. At one drag length the term 40 is below 1e-47, under any tolerance we have.
const TERMS_MAX: u32 = 40;

/// Least change of speed, over the speed, for which speed serves as the variable of time: two bits of the difference are
/// lost there, and depth, with the singularity at least twice as far as the end, is no worse.
const LEAST_FALL: f64 = 0.25;

/// Coefficients of the series for time. A step then takes about a fifth of the radius of convergence at round-off.
const TIME_ORDER: usize = 24;

/// Bound on the steps of one flight, in depth and in time each; ends flights of millions of drag lengths.
const STEPS_MAX: u64 = 1_000_000;

/// Roundings that enter w in a step, in units of its terms: three in each coefficient and one for each sum.
const ROUNDINGS_PER_STEP: f64 = 4.0;

/// Integrates kinetic energy over depth. Exact to round-off unless a tolerance is asked for.
///
/// To be preferred where the outcome or the critical velocity matters: neither has a grazing case here. It is
/// independent of the time-domain methods, which makes it their cross-check.
///
/// Measured over 2,000 varied scenes against the closed form: depth 7e-16, V² 5e-16 of V0², times 3e-14 of their
/// condition number (1e-14 against the same code in double-double, the rest is the closed form's); the error of the
/// margin is at most 0.27 of its stated bar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Relative tolerance of a step; zero stands for the round-off of the number type.
    rtol: f64,
}

impl Energy {
    /// The method at round-off.
    pub fn new() -> Self {
        Self::default()
    }

    /// The method with the relative tolerance `rtol` of each step, above 0 and at most 0.01.
    ///
    /// Tolerances below round-off are taken as round-off.
    ///
    /// # Errors
    /// [`IntegrationError::BadOption`] outside that range, NaN included.
    pub fn with_rtol(rtol: f64) -> Result<Self, IntegrationError> {
        if rtol > 0.0 && rtol <= 0.01 {
            Ok(Self { rtol })
        } else {
            Err(IntegrationError::BadOption {
                option: "rtol",
                value: rtol.to_string(),
                allowed: "a number above 0 and at most 0.01",
            })
        }
    }

    /// Relative tolerance of a step in the number type `S`.
    fn tolerance<S: Scalar>(self) -> f64 {
        self.rtol.max(S::EPSILON)
    }

    /// Integrates `problem` in any number type; dual numbers give the sensitivities of every result.
    ///
    /// Depth and margin are good to a few units of round-off of `S`; times likewise, each times its condition number.
    /// Only a trajectory allocates.
    ///
    /// # Errors
    /// - [`IntegrationError::Refused`]: a stage before the exit depth is viscous;
    /// - [`IntegrationError::NeverEnds`]: an unbounded last stage does not resist at rest;
    /// - [`IntegrationError::NotFinite`], [`IntegrationError::StepBudgetSpent`]: numbers beyond the range of `S`.
    pub fn fly_in<S: Scalar>(&self, problem: &Problem<S>, detail: Detail) -> Result<Flight<S>, IntegrationError> {
        refuse_viscosity(problem)?;
        if let Some(flight) = Flight::at_once(problem) {
            return Ok(flight);
        }
        let tolerance = self.tolerance::<S>();
        let mut log = Log::new(problem, detail);
        let mut walk = Walk::from_impact();
        let mut margin = Least::default();
        let mut now = State { time: S::zero(), depth: S::zero(), velocity: S::one() };
        let mut end = None;

        for (index, stage) in problem.stages.iter().enumerate() {
            let loss = Loss::of(stage, problem)?;
            let limit = problem.limit_of(index);
            if end.is_none() && !limit.value().is_finite() && !stops_somewhere(stage) {
                return Err(IntegrationError::NeverEnds {
                    why: "the last stage does not resist at rest and the target has no far side",
                    last: log.state(now).values(),
                });
            }
            let rest = walk.cross(&loss, limit, tolerance, end.is_none()).map_err(|fault| log.fault(fault, now))?;
            if problem.has_exit() {
                margin.take(walk.w.value(), walk.error);
            }
            if end.is_none() {
                let (depth, velocity) = match rest {
                    Some(depth) => (depth, S::zero()),
                    None => (limit, root_of(walk.w)),
                };
                let leg = Leg { loss, index, tolerance };
                now = leg.elapse(now, depth, velocity, &mut log)?;
                end = log.arrive(index, now, rest.is_some());
            }
            let leaves = stage.end.value() >= problem.exit_depth.value();
            if leaves || (end.is_some() && !problem.has_exit()) {
                break;
            }
        }

        let Some((mut outcome, stage)) = end else {
            return Err(IntegrationError::NeverEnds {
                why: "no stage is left and neither rest nor exit was reached",
                last: log.state(now).values(),
            });
        };
        if problem.has_exit() && margin.value.abs() <= margin.error {
            outcome = Outcome::Undecided;
        }
        log.cost += walk.cost;
        Ok(Flight {
            outcome,
            stage,
            end: log.state(now),
            events: log.events,
            exit_margin: problem.has_exit().then_some(margin.value),
            exit_margin_error: problem.has_exit().then_some(margin.error),
            cost: log.cost,
            trajectory: log.trajectory,
            step_limit: None,
            notes: Vec::new(),
        })
    }

    /// The exit margin of `problem` alone: w is carried to the exit, no root is sought and no time computed.
    ///
    /// The same number as [`Flight::exit_margin`], with its derivatives in a number type that carries them. `None`
    /// without an exit depth, or at no impact speed.
    ///
    /// # Errors
    /// As [`Energy::fly_in`], save that a flight with an exit always ends here.
    pub fn exit_margin_in<S: Scalar>(&self, problem: &Problem<S>) -> Result<Option<(S, f64, Cost)>, IntegrationError> {
        refuse_viscosity(problem)?;
        if !problem.has_exit() || problem.impact_speed.value() <= 0.0 {
            return Ok(None);
        }
        let tolerance = self.tolerance::<S>();
        let mut walk = Walk::from_impact();
        let mut least = S::one();
        let mut margin = Least::default();
        if problem.exit_depth.value() <= 0.0 {
            return Ok(Some((least, 0.0, walk.cost)));
        }
        for (index, stage) in problem.stages.iter().enumerate() {
            let loss = Loss::of(stage, problem)?;
            let from = walk;
            walk.cross(&loss, problem.limit_of(index), tolerance, false).map_err(|fault| {
                let last = State { time: f64::NAN, depth: from.depth.value(), velocity: root_of(from.w).value() };
                fault.error(State { velocity: last.velocity * problem.impact_speed.value(), ..last })
            })?;
            if margin.take(walk.w.value(), walk.error) {
                least = walk.w;
            }
            if stage.end.value() >= problem.exit_depth.value() {
                break;
            }
        }
        Ok(Some((least, margin.error, walk.cost)))
    }
}

impl Integrator for Energy {
    fn name(&self) -> &'static str {
        NAME
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        self.fly_in(problem, detail)
    }

    fn exit_margin(&self, problem: &Problem) -> Result<Option<Margin>, IntegrationError> {
        let margin = self.exit_margin_in(problem)?;
        Ok(margin.map(|(value, error, cost)| Margin { value, error: Some(error), cost }))
    }
}

/// Signed exit energy W(exit) [m²/s²] of `problem` at round-off, negative for a stop; `None` as
/// [`Energy::exit_margin_in`].
///
/// The least W over the stage ends where a target also drives ([`crate::physics::exit_energy`]).
///
/// # Errors
/// As [`Energy::exit_margin_in`].
pub fn exit_energy_of<S: Scalar>(problem: &Problem<S>) -> Result<Option<S>, IntegrationError> {
    let margin = Energy::new().exit_margin_in(problem)?;
    Ok(margin.map(|(value, ..)| value * problem.impact_speed * problem.impact_speed))
}

/// Refuses a problem with viscosity before its exit.
fn refuse_viscosity<S: Scalar>(problem: &Problem<S>) -> Result<(), IntegrationError> {
    for (index, stage) in problem.stages.iter().enumerate() {
        if problem.start_of(index).value() >= problem.exit_depth.value() {
            break;
        }
        if stage.viscosity.value() != 0.0 {
            return Err(IntegrationError::Refused {
                method: NAME,
                why: format!(
                    "stage {index} has a viscosity of {} kg/s, and V² over x is not smooth at rest with it; take \
                     --method taylor or adaptive, or set the viscosity to 0",
                    stage.viscosity.value()
                ),
            });
        }
    }
    Ok(())
}

/// Whether an endless stage brings every projectile to rest: its static force is positive far out.
fn stops_somewhere<S: Scalar>(stage: &Stage<S>) -> bool {
    stage.stiffness.value() > 0.0 || stage.static_force.value() > 0.0
}

/// `√w`, and zero, without the infinite derivative of the root, where w is not positive.
fn root_of<S: Scalar>(w: S) -> S {
    if w.value() > 0.0 { w.sqrt() } else { S::zero() }
}

/// The least margin met so far, with the error bar it had there.
#[derive(Clone, Copy, Debug)]
struct Least {
    value: f64,
    error: f64,
}

impl Default for Least {
    fn default() -> Self {
        Self { value: f64::INFINITY, error: 0.0 }
    }
}

impl Least {
    /// Keeps `value` if it is less; says whether it was.
    fn take(&mut self, value: f64, error: f64) -> bool {
        let less = value < self.value;
        if less {
            *self = Self { value, error };
        }
        less
    }
}

/// What a stage takes from w: `-dw/dx = a + b x + κ w`.
#[derive(Clone, Copy, Debug)]
struct Loss<S> {
    /// a = 2p/(M V0²) [1/m].
    steady: S,
    /// b = 2s/(M V0²) [1/m²].
    growing: S,
    /// κ = 2q/M [1/m], the inverse drag length.
    drag: S,
}

impl<S: Scalar> Loss<S> {
    /// The loss of `stage` in `problem`, whose impact speed is the unit of speed.
    fn of(stage: &Stage<S>, problem: &Problem<S>) -> Result<Self, IntegrationError> {
        // Quotients throughout: neither 1/M nor the square of a speed may leave the range of the number type where the
        // result does not.
        let two = S::from_f64(fault!("energy-factor", 2.0, 1.0));
        let per_mass = |coefficient: S| two * coefficient.over(problem.mass);
        let relative = |force: S| per_mass(force).over(problem.impact_speed).over(problem.impact_speed);
        let loss = Self {
            steady: relative(stage.static_force),
            growing: relative(stage.stiffness),
            drag: fault!("energy-drag", per_mass(stage.drag), stage.drag.over(problem.mass)),
        };
        if [loss.steady, loss.growing, loss.drag].iter().all(|c| c.value().is_finite()) {
            Ok(loss)
        } else {
            Err(IntegrationError::NotFinite { what: "force over M V0²", last: State::at_impact(problem).values() })
        }
    }

    /// `-dw/dx` at depth `x`; proportional to the force, with the same sign.
    fn rate(&self, x: S, w: S) -> S {
        self.steady + self.growing * x + self.drag * w
    }

    /// Whether w has come to its limit -a/κ, so that no way however long changes it: behind a stop a target may be
    /// millions of drag lengths thick, and before one a driven projectile reaches its terminal velocity.
    fn is_settled(&self, x: S, w: S) -> bool {
        let drag = self.drag.value().abs();
        drag > 0.0
            && self.growing.value() == 0.0
            // The limit itself is met to the rounding of w, of κ w and of the sum.
            && self.rate(x, w).value().abs() <= 4.0 * S::EPSILON * drag * w.value().abs()
    }

    /// `w(x + h) - w(x)` by the Taylor series at `x`, and the number of its terms.
    ///
    /// From the third on each term is the one before times `-κ h/n`: the inhomogeneous part is a polynomial of degree
    /// one. Terms are added until one is below `negligible`; what is left out is then smaller still.
    fn change(&self, x: S, w: S, h: S, negligible: f64) -> (S, u32) {
        let drag = self.drag * h;
        let first = -(self.rate(x, w) * h);
        let mut term = -((self.growing * h * h + drag * first) * S::from_f64(0.5));
        let mut higher = term;
        let mut terms = 2;
        while drag.value() != 0.0 && terms < TERMS_MAX && term.value().abs() > negligible {
            terms += 1;
            term = -(drag.over(S::from_f64(f64::from(terms))) * term);
            higher += term;
        }
        (first + higher, terms)
    }

    /// Distance within which the static force alone takes all of `w` [m]; infinite where it never does.
    ///
    /// Rest is not farther than this, since drag only takes more.
    fn static_reach(&self, x: f64, w: f64) -> f64 {
        let (growing, here) = (self.growing.value(), self.steady.value() + self.growing.value() * x);
        let root = here.hypot((2.0 * growing * w).sqrt());
        if here >= 0.0 { 2.0 * w / (here + root) } else { (root - here) / growing }
    }
}

/// Why a walk or a clock broke off.
#[derive(Clone, Copy, Debug)]
enum Fault {
    Budget,
    NotFinite(&'static str),
}

impl Fault {
    fn error(self, last: State) -> IntegrationError {
        match self {
            Self::Budget => IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, last },
            Self::NotFinite(what) => IntegrationError::NotFinite { what, last },
        }
    }
}

/// w on its way through the target.
#[derive(Clone, Copy, Debug)]
struct Walk<S> {
    depth: S,
    w: S,
    /// Bound of the error of w.
    error: f64,
    cost: Cost,
}

impl<S: Scalar> Walk<S> {
    fn from_impact() -> Self {
        Self { depth: S::zero(), w: S::one(), error: 0.0, cost: Cost::default() }
    }

    /// Carries w to `limit`; returns the depth of rest when `seek_rest` and w fell below zero on the way.
    ///
    /// With a finite limit w is carried on to it through rest, else the walk ends at rest. A w of exactly zero at the
    /// limit is an arrival, not a rest before it.
    fn cross(&mut self, loss: &Loss<S>, limit: S, tolerance: f64, seek_rest: bool) -> Result<Option<S>, Fault> {
        let longest = DRAG_LENGTHS_MAX / loss.drag.value().abs();
        let mut rest = None;
        while self.depth.value() < limit.value() {
            if self.cost.steps >= STEPS_MAX {
                return Err(Fault::Budget);
            }
            let (x, w) = (self.depth, self.w);
            if limit.value().is_finite() && loss.is_settled(x, w) {
                self.depth = limit;
                self.error += ROUNDINGS_PER_STEP * S::EPSILON * w.value().abs();
                break;
            }
            let left = limit - x;
            let mut length = longest;
            if !limit.value().is_finite() {
                // Half as far again as rest can be, so that the step holds the root well inside.
                length = length.min(1.5 * loss.static_reach(x.value(), w.value()));
            }
            let last = length >= left.value();
            // The step is the difference of two depths as they are stored: their rounding does not add up on the way.
            let to = if last { limit } else { x + S::from_f64(length) };
            let h = to - x;
            if h.value() <= 0.0 && !limit.value().is_finite() {
                // Rest is nearer than depths can tell apart; the quotient carries its derivatives.
                rest = Some(x + w.over(loss.rate(x, w)));
                break;
            }

            // Every term of the sum, and every part of the rate, is at most of this size.
            let (a, b, drag) = (loss.steady.value().abs(), loss.growing.value(), loss.drag.value());
            let size = w.value().abs() + h.value() * (a + b * to.value() + drag * w.value().abs());
            let negligible = 0.5 * tolerance * size;
            let (change, terms) = loss.change(x, w, h, negligible);
            self.w = w + change;
            self.depth = to;
            self.cost.steps += 1;
            self.cost.force_evaluations += u64::from(terms);
            // An error in w fades as w itself would without a static force.
            self.error = self.error * (-drag * h.value()).exp()
                + (tolerance.max(S::EPSILON) + ROUNDINGS_PER_STEP * S::EPSILON) * size;
            if !self.w.value().is_finite() || !self.error.is_finite() {
                return Err(Fault::NotFinite("V²"));
            }
            let falls = self.w.value() < 0.0 || (self.w.value() == 0.0 && !last);
            if seek_rest && rest.is_none() && falls {
                rest = Some(x + self.root(loss, x, w, h, negligible));
                if !limit.value().is_finite() {
                    break;
                }
            }
        }
        Ok(rest)
    }

    /// The distance in `(0, h]` from `x` at which w, positive at `x` and not beyond `h`, is zero.
    ///
    /// There is just one: once w falls it goes on falling. Newton's method, whose derivative is the equation itself,
    /// kept inside a bracket; its last step is taken in `S` and so carries derivatives and low parts along.
    fn root(&mut self, loss: &Loss<S>, x: S, w: S, h: S, negligible: f64) -> S {
        // Half as far again as rest can be: a step may be longer than that by any power of ten, more than 80 halvings
        // mend. Without drag the first guess is the root.
        let reach = loss.static_reach(x.value(), w.value());
        let nearer = |bound: f64| if bound < h.value() { S::from_f64(bound) } else { h };
        let (mut low, mut high) = (S::zero(), nearer(1.5 * reach));
        let mut at = nearer(reach);
        for _ in 0..80 {
            let (change, terms) = loss.change(x, w, at, negligible);
            self.cost.force_evaluations += u64::from(terms);
            let here = w + change;
            if here.value() > 0.0 {
                low = at;
            } else {
                high = at;
            }
            let step = here.over(loss.rate(x + at, here));
            let next = at + step;
            if step.value().abs() <= 4.0 * S::EPSILON * at.value() {
                return next;
            }
            let inside = (next - low).value() >= 0.0 && (high - next).value() >= 0.0;
            at = if inside { next } else { S::from_f64(0.5) * (low + high) };
            if (high - low).value() <= 2.0 * S::EPSILON * high.value() {
                break;
            }
        }
        at
    }
}

/// Time through one stage.
struct Leg<S> {
    loss: Loss<S>,
    index: usize,
    tolerance: f64,
}

/// Depth [m], speed over V0, and `t̂ = V0 t` [m], in the fields of a state.
type Reduced<S> = State<S>;

impl<S: Scalar> Leg<S> {
    /// The state at depth `depth` and speed `velocity`, known beforehand, with the time it takes to get there.
    fn elapse(
        &self,
        from: Reduced<S>,
        depth: S,
        velocity: S,
        log: &mut Log<'_, S>,
    ) -> Result<Reduced<S>, IntegrationError> {
        let mut now = from;
        let end_rate = self.loss.rate(depth, velocity * velocity).value();
        for _ in 0..STEPS_MAX {
            let way = (depth - now.depth).value();
            let fall = (now.velocity - velocity).value();
            if way <= 0.0 && fall <= 0.0 {
                break;
            }
            let w = now.velocity * now.velocity;
            let rate = self.loss.rate(now.depth, w).value();
            if rate > 0.0 && fall <= 0.0 {
                // The last speed is reached before the end by round-off alone: what is left is flown at it. Going on in
                // depth would close in on a rest that the walk does not have, without ever coming there.
                if velocity.value() > 0.0 {
                    now.time += (depth - now.depth).over(velocity);
                }
                break;
            }
            // Speed is a variable only where it changes one way down to the end. A force that slows goes on slowing;
            // one that drives does so to the end if it still does there.
            let monotone = (rate > 0.0 && fall > 0.0) || (rate < 0.0 && fall < 0.0 && end_rate < 0.0);
            let depth_radius = w.value() / rate.abs();
            let v = now.velocity.value();
            let rate_slope = 2.0 * v * (self.loss.drag.value() - self.loss.growing.value() / rate);
            let speed_radius = (rate / rate_slope).abs();
            // Nor where it hardly changes: the fall is a difference, and its lost digits would be those of the time.
            let falls_much = fall.abs() > LEAST_FALL * v;
            let by_speed = monotone && (way <= 0.0 || (falls_much && speed_radius / fall.abs() > depth_radius / way));
            let done = if by_speed {
                self.step_in_speed(&mut now, velocity, speed_radius)
            } else if way > 0.0 {
                self.step_in_depth(&mut now, depth, depth_radius)
            } else {
                break;
            };
            log.cost.steps += 1;
            log.cost.force_evaluations += TIME_ORDER as u64;
            if !now.time.value().is_finite() || !now.velocity.value().is_finite() {
                return Err(Fault::NotFinite("time or speed").error(log.state(from).values()));
            }
            if done {
                break;
            }
            if now.velocity.value() <= 0.0 {
                // Series and walk differ by round-off: rest is reached, and the end with it.
                break;
            }
            log.step(self.index, now);
            if log.cost.steps >= STEPS_MAX {
                return Err(Fault::Budget.error(log.state(now).values()));
            }
        }
        Ok(State { time: now.time, depth, velocity })
    }

    /// One step of `dt̂/dx = w^(-1/2)`; says whether it reached `end`.
    fn step_in_depth(&self, now: &mut Reduced<S>, end: S, radius: f64) -> bool {
        let left = end - now.depth;
        // Coefficients are those of the depth in units of this length: of order one whatever the scene's scale.
        let unit = S::from_f64(radius.min(left.value()));
        let w0 = now.velocity * now.velocity;
        let drag = self.loss.drag * unit;
        let mut w = [S::zero(); TIME_ORDER];
        w[0] = w0;
        w[1] = -(self.loss.rate(now.depth, w0) * unit);
        w[2] = -((self.loss.growing * unit * unit + drag * w[1]) * S::from_f64(0.5));
        for n in 3..TIME_ORDER {
            w[n] = -(drag * w[n - 1]).over(S::from_f64(n as f64));
        }
        // Power of a series: u = w^(-1/2) obeys 2 w u' = -u w'.
        let mut slowness = [S::zero(); TIME_ORDER];
        slowness[0] = S::one().over(now.velocity);
        for n in 1..TIME_ORDER {
            let mut sum = S::zero();
            for k in 1..=n {
                sum +=
                    S::from_f64(n as f64 - fault!("energy-time-power", 0.5, 1.0) * k as f64) * w[k] * slowness[n - k];
            }
            slowness[n] = -sum.over(S::from_f64(n as f64) * w0);
        }
        let (length, done) = self.step_length(&slowness, left.over(unit));
        now.time += unit * integral(&slowness, length);
        now.velocity = root_of(value(&w, length));
        now.depth = if done { end } else { now.depth + unit * length };
        done
    }

    /// One step of `dt̂/dv = -2/f, dx/dv = -2v/f`; says whether it reached the speed `end`.
    fn step_in_speed(&self, now: &mut Reduced<S>, end: S, radius: f64) -> bool {
        let fall = now.velocity - end;
        // Signed: the speed falls by `unit` for each unit of the series' variable.
        let unit = S::from_f64(radius.min(fall.value().abs()).copysign(fall.value()));
        let two = S::from_f64(2.0);
        let v = now.velocity;
        // f, 2/f and the depth gained, order by order.
        let mut f = [S::zero(); TIME_ORDER];
        let mut inverse = [S::zero(); TIME_ORDER];
        let mut gain = [S::zero(); TIME_ORDER + 1];
        f[0] = self.loss.rate(now.depth, v * v);
        for n in 0..TIME_ORDER {
            if n > 0 {
                f[n] = self.loss.growing * gain[n];
                if n == 1 {
                    f[1] -= two * self.loss.drag * v * unit;
                } else if n == 2 {
                    f[2] += self.loss.drag * unit * unit;
                }
            }
            let mut sum = if n == 0 { two } else { S::zero() };
            for k in 1..=n {
                sum -= f[k] * inverse[n - k];
            }
            inverse[n] = sum.over(f[0]);
            let before = if n == 0 { S::zero() } else { unit * inverse[n - 1] };
            gain[n + 1] = (unit * (v * inverse[n] - before)).over(S::from_f64((n + 1) as f64));
        }
        let (length, done) = self.step_length(&inverse, fall.over(unit));
        now.time += unit * integral(&inverse, length);
        now.depth += value(&gain, length);
        now.velocity = if done { end } else { v - unit * length };
        done
    }

    /// How far a series may be summed, at most to `left`; and whether that is all.
    ///
    /// The last two coefficients decide, since every second one may vanish by symmetry.
    fn step_length(&self, series: &[S; TIME_ORDER], left: S) -> (S, bool) {
        let negligible = self.tolerance * series[0].value().abs();
        let mut length = f64::INFINITY;
        for n in [TIME_ORDER - 2, TIME_ORDER - 1] {
            length = length.min((negligible / series[n].value().abs()).powf(1.0 / n as f64));
        }
        // A NaN coefficient leaves the length infinite and shows in the sum, which is checked.
        if length >= left.value() { (left, true) } else { (S::from_f64(length), false) }
    }
}

/// `Σ c_n z^n`.
fn value<S: Scalar>(series: &[S], z: S) -> S {
    series.iter().rev().fold(S::zero(), |sum, &c| sum * z + c)
}

/// `Σ c_n z^(n+1)/(n+1)`.
fn integral<S: Scalar>(series: &[S], z: S) -> S {
    let mut sum = S::zero();
    for (n, &c) in series.iter().enumerate().rev() {
        sum = sum * z + c.over(S::from_f64((n + 1) as f64));
    }
    sum * z
}

/// What is written down on the way.
struct Log<'a, S> {
    problem: &'a Problem<S>,
    detail: Detail,
    events: Events<S>,
    trajectory: Vec<Sample>,
    cost: Cost,
}

impl<'a, S: Scalar> Log<'a, S> {
    fn new(problem: &'a Problem<S>, detail: Detail) -> Self {
        let mut log = Self { problem, detail, events: Events::new(), trajectory: Vec::new(), cost: Cost::default() };
        log.step(0, State { time: S::zero(), depth: S::zero(), velocity: S::one() });
        log
    }

    /// A reduced state in SI units.
    fn state(&self, now: Reduced<S>) -> State<S> {
        let unit = self.problem.impact_speed;
        State { time: now.time.over(unit), depth: now.depth, velocity: now.velocity * unit }
    }

    fn fault(&self, fault: Fault, now: Reduced<S>) -> IntegrationError {
        fault.error(self.state(now).values())
    }

    /// A row of the trajectory, where one is wanted.
    fn step(&mut self, index: usize, now: Reduced<S>) {
        if self.detail == Detail::Trajectory {
            let state = self.state(now);
            let force = self.problem.stages[index].force(state.depth, state.velocity).value();
            self.trajectory.push(Sample { state: state.values(), force, stage: index });
        }
    }

    fn event(&mut self, kind: EventKind, index: usize, now: Reduced<S>) {
        self.events.push(Event { kind, state: self.state(now) });
        self.step(index, now);
    }

    /// Writes down what happens at `now`, the end of the way through stage `index`; returns how and in which stage
    /// the flight ended, if it did.
    fn arrive(&mut self, index: usize, now: Reduced<S>, rests_before: bool) -> Option<(Outcome, usize)> {
        let problem = self.problem;
        let leaves = !rests_before && now.depth.value() >= problem.exit_depth.value();
        let rests = now.velocity.value() <= 0.0;
        let ends = leaves || rests;
        if self.detail >= Detail::Events {
            for (at, stage) in problem.stages.iter().enumerate().skip(index) {
                // Stages of no length after this one are passed in their own turn, unless the flight ends here.
                if stage.end.value() > now.depth.value() || (at > index && !ends) {
                    break;
                }
                self.event(EventKind::boundary(problem, at), at, now);
            }
        }
        if leaves {
            self.event(EventKind::Exit, index, now);
        }
        if rests {
            self.event(EventKind::Rest, index, now);
        }
        if leaves {
            Some((Outcome::Perforated, index))
        } else if rests {
            Some((problem.stop_in(index), index))
        } else {
            None
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a failed unwrap is a failed test")]
mod tests {
    use std::f64::consts::PI;

    use num_dual::Dual64;
    use twofloat::TwoFloat;

    use super::super::taylor::Taylor;
    use super::*;
    use crate::physics::exit_energy::{self, expm1_over};
    use crate::physics::{Stages, Target};

    fn concrete(mass: f64, v0: f64, exit: f64, kd: f64, p: f64, q: f64, c: Option<f64>) -> Problem {
        let c = c.unwrap_or(mass * (p + q * v0 * v0) / (kd * (mass + kd * q)));
        Problem {
            mass,
            impact_speed: v0,
            exit_depth: exit,
            stages: Stages::from_slice(&[Stage::crater(c, kd), Stage::tunnel(p, q)]),
            crater: Some(0),
            target: Target::CraterAndTunnel,
        }
    }

    fn staged(mass: f64, v0: f64, exit: f64, stages: &[Stage]) -> Problem {
        Problem {
            mass,
            impact_speed: v0,
            exit_depth: exit,
            stages: Stages::from_slice(stages),
            crater: None,
            target: Target::Stages,
        }
    }

    fn stage(p: f64, s: f64, q: f64, end: f64) -> Stage {
        Stage { static_force: p, stiffness: s, viscosity: 0.0, drag: q, end }
    }

    /// Numbers in [0, 1) from a seed (splitmix64).
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        }

        fn between(&mut self, low: f64, high: f64) -> f64 {
            low * (high / low).powf(self.unit())
        }

        /// Concrete of 15 to 135 megapascals, 1 to 10 cm, 30 to 1500 m/s; a quarter each without drag and with a given c.
        fn scene(&mut self, with_exit: bool) -> Problem {
            let d = self.between(0.01, 0.1);
            let mass = self.between(200.0, 1e5) * d * d * d;
            let fc = self.between(15e6, 135e6);
            let area = PI * d * d / 4.0;
            let p = area * 72.0 / (fc / 1e6).sqrt() * fc;
            let q = if self.unit() < 0.25 { 0.0 } else { area * self.between(0.02, 1.0) * 2400.0 };
            let kd = d * self.between(0.5, 3.0);
            let c = if self.unit() < 0.25 { Some(p / kd * self.between(0.5, 2.0)) } else { None };
            let exit = if with_exit { d * self.between(0.3, 20.0) } else { f64::INFINITY };
            concrete(mass, self.between(30.0, 1500.0), exit, kd, p, q, c)
        }
    }

    /// Theory section 2 in f64: depth, time, velocity at the end, and time and velocity at k d.
    struct Closed {
        depth: f64,
        time: f64,
        velocity: f64,
        crater_end: Option<(f64, f64)>,
    }

    fn closed_form(problem: &Problem) -> Closed {
        let (mass, v0) = (problem.mass, problem.impact_speed);
        let (crater, tunnel) = (problem.stages[0], problem.stages[1]);
        let (p, q, kd) = (tunnel.static_force, tunnel.drag, crater.end);
        let w = (crater.stiffness / mass).sqrt();
        let exit = problem.exit_depth;
        if v0 / w <= kd.min(exit) {
            return Closed { depth: v0 / w, time: PI / (2.0 * w), velocity: 0.0, crater_end: None };
        }
        if exit < kd {
            let v = ((v0 - w * exit) * (v0 + w * exit)).sqrt();
            return Closed { depth: exit, time: (w * exit).atan2(v) / w, velocity: v, crater_end: None };
        }
        let v1 = ((v0 - w * kd) * (v0 + w * kd)).sqrt();
        let t1 = (w * kd).atan2(v1) / w;
        let u = q * v1 * v1 / p;
        let rest = kd + mass * v1 * v1 / (2.0 * p) * if u == 0.0 { 1.0 } else { u.ln_1p() / u };
        let (depth, velocity) = if rest < exit {
            (rest, 0.0)
        } else {
            let y = 2.0 * q * (rest - exit) / mass;
            (exit, (2.0 * p * (rest - exit) / mass * expm1_over(y)).sqrt())
        };
        let (a, b) = (v1 * (q / p).sqrt(), velocity * (q / p).sqrt());
        let z = (a - b) / (1.0 + a * b);
        let slope = if z == 0.0 { 1.0 } else { z.atan() / z };
        let time = t1 + mass / p * (v1 - velocity) / (1.0 + a * b) * slope;
        Closed { depth, time, velocity, crater_end: Some((t1, v1)) }
    }

    /// Depth at rest in the tunnel, by theory section 2.
    #[test]
    fn tunnel_scene_agrees_with_fifty_digits() {
        let problem = concrete(2.0, 300.0, f64::INFINITY, 0.1, 848_230.016_469_244_3, 3.251_548_396_465_436, None);
        let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
        assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
        assert!((flight.end.depth / 0.144_826_200_112_217_07 - 1.0).abs() < 1e-15, "{:e}", flight.end.depth);
        assert!((flight.end.time / 8.291_966_948_249_334e-4 - 1.0).abs() < 1e-14, "{:e}", flight.end.time);
        let kd = flight.crater_end().unwrap();
        assert!((kd.time / 3.749_918_414_549_262e-4 - 1.0).abs() < 1e-14, "{:e}", kd.time);
        assert!((kd.velocity / 202.320_580_497_900_37 - 1.0).abs() < 1e-15, "{:e}", kd.velocity);
        assert_eq!(flight.events.len(), 2);
        assert_eq!(flight.exit_margin, None);
    }

    /// Depth and times against the closed form; velocities lose digits by themselves where w is small, so their limit
    /// is one of w: 2 v dv, in units of V0.
    #[test]
    fn two_thousand_varied_scenes_agree_with_the_closed_form() {
        let mut random = Random(1);
        let (mut depth, mut time, mut speed) = (0.0_f64, 0.0_f64, 0.0_f64);
        for case in 0..2000 {
            let problem = random.scene(case % 2 == 0);
            let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
            let exact = closed_form(&problem);
            assert_ne!(flight.outcome, Outcome::Undecided, "case {case}");
            assert_eq!(flight.outcome == Outcome::Perforated, exact.velocity > 0.0, "case {case}");
            depth = depth.max((flight.end.depth / exact.depth - 1.0).abs());
            let v0 = problem.impact_speed;
            let of_w = |v: f64, exact: f64| (v - exact).abs() / v0 * ((v + exact) / v0);
            speed = speed.max(of_w(flight.end.velocity, exact.velocity));
            // Below w = 1 % the times are conditioned by the square root.
            let mut least = if exact.velocity > 0.0 { exact.velocity / v0 } else { 1.0 };
            if let Some((t1, v1)) = exact.crater_end {
                let kd = flight.crater_end().unwrap();
                speed = speed.max(of_w(kd.velocity, v1));
                least = least.min(v1 / v0);
                time = time.max((kd.time / t1 - 1.0).abs() * least.min(1.0));
            }
            time = time.max((flight.end.time / exact.time - 1.0).abs() * least.min(1.0));
        }
        println!("depth {depth:e}, time {time:e}, V² {speed:e}");
        assert!(depth < 5e-15, "depth {depth:e}");
        assert!(time < 1e-13, "time {time:e}");
        assert!(speed < 2e-14, "velocity {speed:e}");
    }

    #[test]
    fn stages_that_the_flight_does_not_reach_are_not_asked() {
        // Over M V0² the second force is beyond the range of f64.
        let stages = [stage(0.1, 0.0, 0.0, 0.5), stage(1e300, 0.0, 0.0, f64::INFINITY)];
        let of = |exit| staged(1e-200, 1e100, exit, &stages);
        assert!(matches!(Energy::new().fly(&of(0.6), Detail::End), Err(IntegrationError::NotFinite { .. })));
        assert_eq!(Energy::new().fly(&of(0.4), Detail::End).unwrap().outcome, Outcome::Perforated);
        assert!(Energy::new().exit_margin_in(&of(0.4)).unwrap().is_some());
        let stopping = [stage(1e6, 0.0, 0.0, 0.5), stages[1]];
        assert_eq!(Energy::new().fly(&staged(1e-9, 10.0, f64::INFINITY, &stopping), Detail::End).unwrap().stage, 0);
        // Nor is their viscosity, which is not flown through.
        let viscous = [Stage { viscosity: 1.0, ..stage(1.0, 0.0, 0.0, f64::INFINITY) }];
        assert!(Energy::new().fly(&staged(2.0, 10.0, 0.0, &viscous), Detail::End).is_ok());
    }

    #[test]
    fn a_margin_out_of_range_is_an_error_with_the_last_speed() {
        let endless = [stage(0.0, 1e300, 0.0, f64::INFINITY)];
        let error = Energy::new().exit_margin_in(&staged(1.0, 3.0, 1e10, &endless)).unwrap_err();
        assert!(matches!(error, IntegrationError::NotFinite { what: "V²", .. }), "{error}");
        assert_eq!(error.last().map(|last| (last.depth, last.velocity)), Some((0.0, 3.0)));
    }

    #[test]
    fn the_root_of_nothing_has_no_infinite_derivative() {
        assert_eq!(root_of(Dual64::new(0.0, 1.0)).eps, 0.0);
    }

    /// The bar of the margin is a bound: the same code in double-double, from the same coefficients, is the reference.
    #[test]
    fn the_stated_bar_of_the_margin_holds_and_is_not_idle() {
        let mut random = Random(2);
        for rtol in [0.0, 1e-12, 1e-9, 1e-6, 1e-3] {
            let method = if rtol > 0.0 { Energy::with_rtol(rtol).unwrap() } else { Energy::new() };
            let mut worst = 0.0_f64;
            for case in 0..1000 {
                let problem = random.scene(true);
                let (value, error, _) = method.exit_margin_in(&problem).unwrap().unwrap();
                let (exact, ..) = Energy::new().exit_margin_in(&problem.cast::<TwoFloat>()).unwrap().unwrap();
                let true_error = (exact - TwoFloat::from(value)).value().abs();
                assert!(true_error <= error, "case {case}, rtol {rtol:e}: error {true_error:e}, bar {error:e}");
                worst = worst.max(true_error / error);
            }
            println!("rtol {rtol:e}: worst error over bar {worst}");
            assert!(worst > 1e-3, "rtol {rtol:e}: the bar is {worst} of what is needed");
        }
    }

    /// A barrier that cancels six digits of w, then drag alone, over which the error left by the barrier fades with w.
    #[test]
    fn bar_of_the_margin_fades_with_drag_as_the_error_does() {
        let mut random = Random(7);
        for case in 0..500 {
            let length = random.between(0.9, 1.0);
            let left = 1e-6 * (1.0 + random.unit());
            let barrier = stage(0.5 * (1.0 - left) / length, 0.0, 0.0, length);
            let problem = staged(1.0, 1.0, 6.0, &[barrier, stage(0.0, 0.0, 0.5, f64::INFINITY)]);
            let (value, error, _) = Energy::new().exit_margin_in(&problem).unwrap().unwrap();
            let (exact, ..) = Energy::new().exit_margin_in(&problem.cast::<TwoFloat>()).unwrap().unwrap();
            let true_error = (exact - TwoFloat::from(value)).value().abs();
            assert!(true_error <= error, "case {case}: error {true_error:e}, bar {error:e}");
            assert!(error < 1e-15 * (-5.0_f64).exp() * 3.0, "case {case}: bar {error:e}");
        }
    }

    #[test]
    fn tolerance_is_obeyed_and_saves_work() {
        let problem = concrete(2.0, 900.0, 0.4, 0.1, 848_230.0, 3.25, None);
        let exact = Energy::new().fly(&problem, Detail::Events).unwrap();
        let mut evaluations = exact.cost.force_evaluations;
        for rtol in [1e-12, 1e-9, 1e-6, 1e-3] {
            let flight = Energy::with_rtol(rtol).unwrap().fly(&problem, Detail::Events).unwrap();
            assert!((flight.end.velocity / exact.end.velocity - 1.0).abs() < 10.0 * rtol);
            assert!((flight.end.time / exact.end.time - 1.0).abs() < 10.0 * rtol);
            assert!(flight.cost.force_evaluations < evaluations, "rtol {rtol:e}");
            evaluations = flight.cost.force_evaluations;
        }
        for bad in [0.0, -1e-6, 0.5, f64::NAN] {
            assert!(Energy::with_rtol(bad).unwrap_err().is_usage(), "rtol {bad}");
        }
    }

    /// `exit_energy::carry` is the closed form of the same quantity, from the depth of rest.
    #[test]
    fn margin_is_the_one_that_the_outcome_implies() {
        let mut random = Random(3);
        for case in 0..1000 {
            let problem = random.scene(true);
            let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
            let implied =
                exit_energy::exit_margin(&problem, flight.outcome, flight.stage, flight.end, &flight.events).unwrap();
            let margin = flight.exit_margin.unwrap();
            assert!((implied - margin).abs() <= 4e-14 * (1.0 + margin.abs()), "case {case}: {margin:e} {implied:e}");
            let (alone, bar, _) = Energy::new().exit_margin_in(&problem).unwrap().unwrap();
            assert_eq!((alone, Some(bar)), (margin, flight.exit_margin_error), "case {case}");
        }
    }

    #[test]
    fn margin_is_affine_in_the_square_of_the_impact_speed() {
        let w = |v0: f64| exit_energy_of(&concrete(2.0, v0, 0.4, 0.1, 848_230.0, 3.25, None)).unwrap().unwrap();
        let (low, middle, high) = (w(100.0), w(500.0), w(900.0));
        let line =
            low + (high - low) * (500.0_f64.powi(2) - 100.0_f64.powi(2)) / (900.0_f64.powi(2) - 100.0_f64.powi(2));
        assert!(low < 0.0 && high > 0.0);
        assert!((line - middle).abs() < 1e-14 * high.abs().max(low.abs()), "{line:e} {middle:e}");
    }

    /// At V0 = `V_c` (1 ± 10^-j) the sign is right, or the outcome undecided: never silently wrong.
    #[test]
    fn outcome_near_the_critical_velocity_is_right_or_undecided() {
        let (mass, p, q, kd, h) = (2.0, 848_230.0_f64, 3.25_f64, 0.1, 0.4_f64);
        let v1c = 2.0 * p * (h - kd) / mass * expm1_over(2.0 * q * (h - kd) / mass);
        let critical = ((v1c * (mass + kd * q) + kd * p) / mass).sqrt();
        for j in 1..=18 {
            for sign in [-1.0, 1.0] {
                let v0 = critical * (1.0 + sign * 10.0_f64.powi(-j));
                let flight = Energy::new().fly(&concrete(mass, v0, h, kd, p, q, None), Detail::Events).unwrap();
                match flight.outcome {
                    Outcome::Undecided => assert!(j > 13, "undecided at 1e-{j}"),
                    Outcome::Perforated => assert!(sign > 0.0, "1e-{j}"),
                    _ => assert!(sign < 0.0, "1e-{j}"),
                }
                let bar = flight.exit_margin_error.unwrap();
                assert_eq!(flight.outcome == Outcome::Undecided, flight.exit_margin.unwrap().abs() <= bar);
            }
        }
    }

    #[test]
    fn viscous_stage_is_refused_unless_it_lies_beyond_the_exit() {
        let mut problem = concrete(2.0, 300.0, 0.3, 0.1, 8e5, 3.0, None);
        problem.stages[1].viscosity = 5.0;
        let refusal = Energy::new().fly(&problem, Detail::Events).unwrap_err();
        assert!(refusal.is_usage() && refusal.to_string().contains("viscosity of 5 kg/s"), "{refusal}");
        assert!(exit_energy_of(&problem).is_err());
        problem.exit_depth = 0.05;
        assert!(Energy::new().fly(&problem, Detail::Events).is_ok());
    }

    #[test]
    fn flights_without_an_end_are_errors() {
        for last in [
            stage(0.0, 0.0, 0.0, f64::INFINITY),
            stage(0.0, 0.0, 1.0, f64::INFINITY),
            stage(-5.0, 0.0, 1.0, f64::INFINITY),
        ] {
            let problem = staged(1.0, 10.0, f64::INFINITY, &[stage(1.0, 0.0, 0.0, 0.1), last]);
            let error = Energy::new().fly(&problem, Detail::Events).unwrap_err();
            assert!(matches!(error, IntegrationError::NeverEnds { last, .. } if last.depth == 0.1), "{error}");
        }
    }

    #[test]
    fn numbers_out_of_range_are_errors_with_the_state_reached() {
        let problem = staged(1e-300, 1e-5, 1.0, &[stage(1e300, 0.0, 0.0, f64::INFINITY)]);
        let error = Energy::new().fly(&problem, Detail::Events).unwrap_err();
        assert!(matches!(error, IntegrationError::NotFinite { .. }), "{error}");
        // A drive that fades over 1e9 drag lengths, followed step by step: bounded, not hung.
        let problem = staged(1.0, 1.0, 1e9, &[stage(-1.0, 1e-10, 1.0, f64::INFINITY)]);
        let error = Energy::new().fly(&problem, Detail::Events).unwrap_err();
        assert!(matches!(error, IntegrationError::StepBudgetSpent { .. }), "{error}");
    }

    /// A terminal speed is the same however long it is kept.
    #[test]
    fn terminal_speed_over_a_billion_drag_lengths_takes_one_step() {
        let problem = staged(1.0, 1.0, 1e9, &[stage(-1.0, 0.0, 1.0, f64::INFINITY)]);
        let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
        assert_eq!((flight.end.time, flight.end.velocity), (1e9, 1.0));
        assert!(flight.cost.steps < 5 && flight.exit_margin_error.unwrap() > 0.0);
    }

    /// A gap, a jump and a coast: each piece has an elementary time.
    #[test]
    fn uniform_motion_and_parabola_are_exact() {
        let problem = staged(2.0, 8.0, 5.0, &[stage(0.0, 0.0, 0.0, 1.0), stage(16.0, 0.0, 0.0, f64::INFINITY)]);
        let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
        // 1/8 s at 8 m/s, then a = -8 m/s²: rest after 1 s and 4 m, which is the exit: touched, at rest.
        assert_eq!((flight.end.depth, flight.end.time, flight.end.velocity), (5.0, 1.125, 0.0));
        let names: Vec<_> = flight.events.iter().map(|e| e.kind.name()).collect();
        assert_eq!(names, ["stage-end", "exit", "rest"]);
        assert_eq!(flight.outcome, Outcome::Undecided);
        assert_eq!(flight.exit_margin, Some(0.0));
    }

    #[test]
    fn rest_exactly_at_the_end_of_the_crater_is_a_stop_in_the_crater() {
        // V0 = w k d with w = 4, k d = 0.5: w(k d) is exactly zero.
        let problem = concrete(2.0, 2.0, f64::INFINITY, 0.5, 100.0, 0.0, Some(32.0));
        let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
        assert_eq!(flight.outcome, Outcome::StoppedInCrater);
        let names: Vec<_> = flight.events.iter().map(|e| e.kind.name()).collect();
        assert_eq!(names, ["crater-end", "rest"]);
        assert!((flight.end.time / (PI / 8.0) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn all_that_happens_at_one_place_is_listed_in_order() {
        // Two boundaries and the exit at 1 m.
        let free = stage(0.0, 0.0, 0.0, 1.0);
        let problem = staged(1.0, 2.0, 1.0, &[free, free, stage(1.0, 0.0, 0.0, f64::INFINITY)]);
        let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
        let kinds: Vec<_> = flight.events.iter().map(|e| e.kind).collect();
        assert_eq!(kinds, [EventKind::StageEnd(0), EventKind::StageEnd(1), EventKind::Exit]);
        assert_eq!((flight.outcome, flight.end.time, flight.exit_margin), (Outcome::Perforated, 0.5, Some(1.0)));
        // A stage of no length on the way is passed once.
        let problem = staged(1.0, 2.0, 3.0, &[free, free, stage(0.0, 0.0, 0.0, f64::INFINITY)]);
        let kinds: Vec<_> =
            Energy::new().fly(&problem, Detail::Events).unwrap().events.iter().map(|e| e.kind).collect();
        assert_eq!(kinds, [EventKind::StageEnd(0), EventKind::StageEnd(1), EventKind::Exit]);
    }

    /// `p < 0, s > 0`: theory section 2, `p, s` with u0 = p/s. The speed first rises, then falls to rest.
    #[test]
    fn driven_flight_through_its_fastest_point_agrees_with_the_closed_form() {
        let mut random = Random(4);
        for _ in 0..300 {
            let (m, s, p, v0) = (1.0, random.between(1.0, 1e4), -random.between(0.1, 1e4), random.between(1e-3, 1e3));
            let (w, u0) = ((s / m).sqrt(), p / s);
            // Below zero u0 the closed form of the depth cancels; this is the same root, added.
            let depth = (v0 / w).hypot(u0) - u0;
            let time = v0.atan2(w * u0) / w;
            let flight =
                Energy::new().fly(&staged(m, v0, f64::INFINITY, &[stage(p, s, 0.0, f64::INFINITY)]), Detail::Events);
            let end = flight.unwrap().end;
            assert!((end.depth / depth - 1.0).abs() < 2e-14, "s {s} p {p} v0 {v0}: {:e} {depth:e}", end.depth);
            assert!((end.time / time - 1.0).abs() < 2e-13, "s {s} p {p} v0 {v0}: {:e} {time:e}", end.time);
        }
    }

    /// `p, s, q`: the general stage, against its closed form.
    #[test]
    fn velocity_behind_a_general_stage_agrees_with_the_closed_form() {
        let mut random = Random(5);
        for _ in 0..300 {
            let (p, s, q) = (random.unit() * 20.0 - 5.0, random.unit() * 50.0, random.unit() * 20.0);
            let law = stage(p, s, q, f64::INFINITY);
            let problem = staged(2.0, 10.0, 0.7, &[stage(0.0, 0.0, 0.0, 0.2), law]);
            let w = exit_energy::carry(&law, 2.0, 100.0, 0.2, 0.7);
            let found = exit_energy_of(&problem).unwrap().unwrap();
            assert!((found - w).abs() < 4e-14 * 100.0, "{found:e} {w:e}");
        }
    }

    /// A barrier, then a drive strong enough to make W positive again had the projectile passed.
    #[test]
    fn barrier_before_a_drive_decides_the_margin() {
        let stages = [stage(10.0, 0.0, 0.0, 1.0), stage(-100.0, 0.0, 0.0, f64::INFINITY)];
        // W = V0² - 20 behind the barrier, V0² + 180 at the exit.
        for (v0, outcome) in [(4.0, Outcome::Stopped), (5.0, Outcome::Perforated)] {
            let flight = Energy::new().fly(&staged(1.0, v0, 2.0, &stages), Detail::Events).unwrap();
            assert_eq!(flight.outcome, outcome);
            let margin = (v0 * v0 - 20.0) / (v0 * v0);
            assert!((flight.exit_margin.unwrap() - margin).abs() < 1e-15);
        }
    }

    #[test]
    fn time_is_regular_when_the_speed_almost_vanishes_at_a_boundary() {
        // W at the end of the first stage is 2^-40 V0²; the second stage drives, slows or lets go.
        let tiny = 2.0_f64.powi(-40);
        let first = stage(0.5 * (1.0 - tiny), 0.0, 0.0, 1.0);
        let v1 = tiny.sqrt();
        for p in [-0.5_f64, 0.5, 0.0] {
            let problem = staged(1.0, 1.0, 1.0 + tiny, &[first, stage(p, 0.0, 0.0, f64::INFINITY)]);
            let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
            let t1 = 2.0 / (1.0 + v1);
            assert!((flight.events[0].state.time / t1 - 1.0).abs() < 1e-14);
            let v2 = (tiny * (1.0 - 2.0 * p)).sqrt();
            let t2 = 2.0 * tiny / (v1 + v2);
            assert!((flight.end.time - t1 - t2).abs() < 1e-14, "p {p}: {:e}", flight.end.time - t1 - t2);
        }
    }

    /// dX/dV0, dT/dV0 and dW(H)/dV0 against differences of the closed form.
    #[test]
    fn dual_numbers_carry_sensitivities_through_rest() {
        let (mass, p, q, kd, c) = (2.0, 848_230.0, 3.25, 0.1, 9e6);
        let problem = |v0| concrete(mass, v0, f64::INFINITY, kd, p, q, Some(c));
        let mut dual = problem(300.0).cast::<Dual64>();
        dual.impact_speed = dual.impact_speed.derivative();
        let flight = Energy::new().fly_in(&dual, Detail::Events).unwrap();
        // V1² = V0² - c (k d)²/M; dX/dV1² = M/(2 (P + Q V1²)).
        let v1_squared = 300.0_f64.powi(2) - c * kd * kd / mass;
        let exact = 300.0 * mass / (p + q * v1_squared);
        assert!((flight.end.depth.eps / exact - 1.0).abs() < 1e-13, "{:e} {exact:e}", flight.end.depth.eps);
        let h = 1e-3;
        let difference = (closed_form(&problem(300.0 + h)).time - closed_form(&problem(300.0 - h)).time) / (2.0 * h);
        assert!((flight.end.time.eps / difference - 1.0).abs() < 1e-8, "{:e} {difference:e}", flight.end.time.eps);
    }

    /// The same code in double-double takes the tunnel scene on to the twenty digits known of it: nothing in it is
    /// of `f64` only, and the series are summed as far as the number type asks.
    #[test]
    fn double_double_reaches_beyond_f64() {
        let (p, q) = (848_230.016_469_244_3, 3.251_548_396_465_436);
        // c is computed in double-double too, since the digits were.
        let mut problem = concrete(2.0, 300.0, f64::INFINITY, 0.1, p, q, Some(1.0)).cast::<TwoFloat>();
        let of = TwoFloat::from;
        let (mass, kd) = (problem.mass, problem.stages[0].end);
        problem.stages[0].stiffness = (mass * (of(p) + of(q) * of(9e4))).over(kd * (mass + kd * of(q)));
        let end = Energy::new().fly_in(&problem, Detail::End).unwrap().end;
        // Twenty digits, 0.14482620011221707453 m and 8.2919669482493341157e-4 s, in two exact pieces each.
        let digits = |head: f64, tail: f64, scale: f64| (TwoFloat::new_mul(head, 1e6) + of(tail)).over(of(scale));
        let depth = (end.depth.over(digits(14_482_620_011_221.0, 707_453.0, 1e20)) - of(1.0)).value().abs();
        let time =
            (end.time.over(digits(82_919_669_482_493.0, 341_157.0, 1e22).over(of(10.0))) - of(1.0)).value().abs();
        assert!(depth < 5e-20 && time < 5e-20, "depth {depth:e}, time {time:e}");
    }

    /// Independent of any known digits: loosening the tolerance changes no more than it says.
    #[test]
    fn tolerance_is_obeyed_below_the_round_off_of_f64() {
        let problem = concrete(2.0, 300.0, f64::INFINITY, 0.1, 848_230.0, 3.25, None).cast::<TwoFloat>();
        let fine = Energy::new().fly_in(&problem, Detail::End).unwrap();
        let coarse = Energy::with_rtol(1e-25).unwrap().fly_in(&problem, Detail::End).unwrap();
        let depth = ((fine.end.depth - coarse.end.depth).over(fine.end.depth)).value().abs();
        let time = ((fine.end.time - coarse.end.time).over(fine.end.time)).value().abs();
        assert!(depth < 1e-24 && time < 1e-24, "depth {depth:e}, time {time:e}");
    }

    #[test]
    fn trajectory_ascends_and_keeps_the_energy_balance() {
        let problem = concrete(2.0, 300.0, f64::INFINITY, 0.1, 848_230.0, 3.25, None);
        let flight = Energy::new().fly(&problem, Detail::Trajectory).unwrap();
        let rows = &flight.trajectory;
        assert!(rows.len() > 8);
        assert_eq!(rows[0].state, State::at_impact(&problem));
        assert_eq!(rows[rows.len() - 1].state, flight.end);
        for pair in rows.windows(2) {
            assert!(pair[1].state.time > pair[0].state.time, "{pair:?}");
            assert!(pair[1].state.depth > pair[0].state.depth, "{pair:?}");
            let (before, after) = (pair[0].state, pair[1].state);
            let law = &problem.stages[pair[1].stage];
            let w = exit_energy::carry(law, problem.mass, before.velocity.powi(2), before.depth, after.depth);
            assert!((w - after.velocity.powi(2)).abs() < 1e-10, "{w:e} {:e}", after.velocity.powi(2));
        }
        assert!(Energy::new().fly(&problem, Detail::Events).unwrap().trajectory.is_empty());
    }

    #[test]
    fn work_without_times_is_two_terms_a_stage_when_there_is_no_drag() {
        let problem = concrete(2.0, 300.0, 0.3, 0.1, 848_230.0, 0.0, None);
        let (_, _, cost) = Energy::new().exit_margin_in(&problem).unwrap().unwrap();
        assert_eq!(cost, Cost { steps: 2, rejected_steps: 0, force_evaluations: 4 });
    }

    #[test]
    fn flight_with_its_events_holds_no_heap_memory() {
        let problem = concrete(2.0, 900.0, 0.3, 0.1, 848_230.0, 3.25, None);
        let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
        assert!(flight.events.len() == 2 && !flight.events.spilled());
        assert_eq!((flight.trajectory.capacity(), flight.notes.capacity()), (0, 0));
    }

    #[test]
    fn impact_speed_zero_and_exit_at_the_face_end_at_once() {
        let mut problem = concrete(2.0, 0.0, 0.3, 0.1, 8e5, 3.0, Some(8e6));
        assert_eq!(Energy::new().fly(&problem, Detail::Events).unwrap().outcome, Outcome::StoppedInCrater);
        assert_eq!(exit_energy_of(&problem).unwrap(), None);
        problem.impact_speed = 10.0;
        problem.exit_depth = 0.0;
        assert_eq!(Energy::new().fly(&problem, Detail::Events).unwrap().outcome, Outcome::Perforated);
        assert_eq!(exit_energy_of(&problem).unwrap(), Some(100.0));
    }

    /// Stages of either sign in any order over twelve decades of scale. Double-double takes other steps, and other
    /// variables in them, so it tells whether the times depend on the way they were computed.
    #[test]
    fn any_stages_at_any_scale_give_ascending_events_and_the_times_of_double_double() {
        let mut random = Random(6);
        let (mut flights, mut worst) = (0, 0.0_f64);
        for case in 0..3000 {
            let (m, v0, unit) = (random.between(1e-6, 1e6), random.between(1e-6, 1e6), random.between(1e-6, 1e6));
            let energy = m * v0 * v0;
            let mut stages = Vec::new();
            let mut end = 0.0;
            for _ in 0..4 {
                let mut pick = |share: f64, size: f64| if random.unit() < share { random.unit() * size } else { 0.0 };
                let (static_force, drive, s, q) = (pick(0.6, 2.0), pick(0.3, 2.0), pick(0.4, 2.0), pick(0.5, 4.0));
                end += unit * pick(0.9, 1.0);
                stages.push(stage((static_force - drive) * energy / unit, s * energy / unit / unit, q * m / unit, end));
            }
            let last = stages.len() - 1;
            stages[last].end = f64::INFINITY;
            let problem = staged(m, v0, if case % 2 == 0 { f64::INFINITY } else { end }, &stages);
            let flight = match Energy::new().fly(&problem, Detail::Trajectory) {
                Ok(flight) => flight,
                Err(IntegrationError::NeverEnds { .. }) => continue,
                Err(other) => panic!("case {case}: {other}"),
            };
            if flight.end.time == 0.0 {
                continue;
            }
            flights += 1;
            for pair in flight.trajectory.windows(2) {
                assert!(pair[1].state.time >= pair[0].state.time, "case {case}: {pair:?}");
                assert!(pair[1].state.depth >= pair[0].state.depth, "case {case}: {pair:?}");
            }
            assert!(flight.cost.steps < 400, "case {case}: {:?}", flight.cost);
            let fine = Energy::new().fly_in(&problem.cast::<TwoFloat>(), Detail::Events).unwrap().values();
            let slowest = flight.events.iter().map(|e| e.state.velocity / v0).filter(|v| *v > 0.0).fold(1.0, f64::min);
            assert_eq!(flight.events.len(), fine.events.len(), "case {case}");
            // A time is conditioned like 1/v at a boundary, and once more where that speed is left uphill.
            let error = (flight.end.time / fine.end.time - 1.0).abs() * slowest * slowest;
            worst = worst.max(error);
            assert!(error < 1e-13, "case {case}: {error:e} {flight:?}");
        }
        println!("{flights} flights, worst time error {worst:e}");
        assert!(flights > 2000);
    }

    fn loss(steady: f64, growing: f64, drag: f64) -> Loss<f64> {
        Loss { steady, growing, drag }
    }

    /// Two stages of any kind, driven ones among them, of a few drag lengths at most; M = 1.
    fn general(random: &mut Random) -> Problem {
        let v0 = random.between(0.5, 2.0);
        let mut law = |end: f64| {
            let force = v0 * v0 * (4.0 * random.unit() - 2.0);
            let stiffness = if random.unit() < 0.6 { v0 * v0 * random.between(0.1, 10.0) } else { 0.0 };
            let drag = if random.unit() < 0.7 { random.between(0.05, 5.0) } else { 0.0 };
            stage(force, stiffness, drag, end)
        };
        let stages = [law(0.3), law(f64::INFINITY)];
        staged(1.0, v0, 0.3 + random.between(0.05, 1.0), &stages)
    }

    #[test]
    fn what_a_flight_costs_is_counted() {
        let cost = |problem: &Problem| Energy::new().fly(problem, Detail::End).unwrap().cost;
        let counted = |steps, force_evaluations| Cost { steps, rejected_steps: 0, force_evaluations };
        // A gap: one step of two terms for w, one of 24 for the time.
        assert_eq!(cost(&staged(1.0, 2.0, 1.0, &[stage(0.0, 0.0, 0.0, f64::INFINITY)])), counted(2, 26));
        // Constant forces, w = 1/4 behind the first, rest in the second: two steps each, and one trial of two terms.
        let stages = [stage(0.75, 0.0, 0.0, 1.0), stage(0.5, 0.0, 0.0, f64::INFINITY)];
        assert_eq!(cost(&staged(2.0, 1.0, f64::INFINITY, &stages)), counted(4, 54));
        assert_eq!(Energy::new().name(), "energy");
    }

    #[test]
    fn of_equal_margins_the_first_is_kept_with_its_bar() {
        let mut least = Least::default();
        assert!(least.take(0.5, 0.125) && !least.take(0.5, 0.25) && !least.take(0.75, 0.5));
        assert_eq!((least.value, least.error), (0.5, 0.125));
    }

    /// At one drag length, from w = 1 with drag alone, the terms are 1/n!.
    #[test]
    fn a_sum_ends_with_the_first_term_that_is_negligible_and_within_its_bound() {
        let law = loss(0.0, 0.0, 1.0);
        for (negligible, terms) in [(0.6, 2), (0.5, 2), (0.4, 3), (1e-3, 7), (0.0, TERMS_MAX)] {
            assert_eq!(law.change(0.0, 1.0, 1.0, negligible).1, terms, "{negligible}");
        }
    }

    #[test]
    fn the_static_reach_is_the_way_on_which_the_static_force_takes_all() {
        for (a, b, x, w) in [
            (3.0, 0.0, 0.0, 2.5),
            (3.0, 2.0, 0.5, 0.7),
            (-3.0, 2.0, 0.5, 0.7),
            (-3.0, 2.0, 4.0, 0.7),
            (0.0, 2.0, 0.0, 1e-3),
            (-1e3, 5.0, 1.0, 4.0),
        ] {
            let reach = loss(a, b, 0.7).static_reach(x, w);
            let (steady, growing) = ((a + b * x) * reach, 0.5 * b * reach * reach);
            let off = (steady + growing - w).abs() / (steady.abs() + growing + w);
            assert!(reach > 0.0 && off < 1e-15, "{a}, {b}, {x}, {w}: {reach}, {off:e}");
        }
        for a in [0.0, -1.0] {
            assert_eq!(loss(a, 0.0, 1.0).static_reach(0.5, 1.0), f64::INFINITY);
        }
    }

    /// Powers of two as units of length and speed: no number rounds differently, and no trial is taken more.
    #[test]
    fn units_are_free_to_the_bit() {
        let mut random = Random(8);
        for case in 0..200 {
            let mut problem = general(&mut random);
            if case % 2 == 0 {
                problem.exit_depth = f64::INFINITY;
            }
            let Ok(flight) = Energy::new().fly(&problem, Detail::Events) else { continue };
            for (length, speed) in [(67, 0), (-67, 0), (3, 40), (-2, -40)] {
                let (l, v) = (2_f64.powi(length), 2_f64.powi(speed));
                let mut scaled = problem.clone();
                scaled.impact_speed *= v;
                scaled.exit_depth *= l;
                for law in &mut scaled.stages {
                    law.static_force *= v * v / l;
                    law.stiffness *= v * v / l / l;
                    law.drag /= l;
                    law.end *= l;
                }
                let other = Energy::new().fly(&scaled, Detail::Events).unwrap();
                let end = State {
                    time: flight.end.time / v * l,
                    depth: flight.end.depth * l,
                    velocity: flight.end.velocity * v,
                };
                assert_eq!((other.end, other.cost), (end, flight.cost), "case {case}, 2^{length} m, 2^{speed} m/s");
                assert_eq!(other.exit_margin_error, flight.exit_margin_error, "case {case}");
            }
        }
    }

    /// Two methods that share neither a variable nor a line.
    #[test]
    fn times_of_driven_and_resisted_flights_are_those_of_the_equation_in_time() {
        let mut random = Random(9);
        let (mut flights, mut worst) = (0, 0.0_f64);
        for case in 0..600 {
            let problem = general(&mut random);
            let flight = Energy::new().fly(&problem, Detail::Events).unwrap();
            let exact = Taylor::default().fly(&problem, Detail::Events).unwrap();
            let slowest = exact.events.iter().map(|e| e.state.velocity).filter(|v| *v > 0.0).fold(1.0, f64::min);
            if flight.exit_margin.unwrap().abs() < 1e-3 || slowest < 0.05 {
                continue;
            }
            flights += 1;
            assert_eq!(flight.outcome, exact.outcome, "case {case}");
            let off = flight.end.time / exact.end.time - 1.0;
            worst = worst.max(off.abs());
            assert!(off.abs() < 2e-14, "case {case}: {off:e} {problem:?}");
        }
        println!("{flights} flights, worst {worst:e}");
        assert!(flights > 550, "{flights}");
        // Out past the fastest point, half as fast again as at impact: -dw/dx = -10 + 5 x + w. A step of a loose tolerance
        // could take the speed at the end for the same on the way up.
        let problem = staged(1.0, 1.0, 2.2, &[stage(-5.0, 2.5, 0.5, f64::INFINITY)]);
        let exact = Taylor::default().fly(&problem, Detail::End).unwrap().end.time;
        for (method, limit) in [(Energy::new(), 2e-14), (Energy::with_rtol(1e-3).unwrap(), 1e-3)] {
            let off = method.fly(&problem, Detail::End).unwrap().end.time / exact - 1.0;
            assert!(off.abs() < limit, "{method:?}: {off:e}");
        }
    }

    /// `V' = 1 - V²`: V = coth or tanh of t + c, `x = ln sinh(t + c)` or `ln cosh(t + c)` less the same at c.
    #[test]
    fn a_speed_that_comes_to_its_limit_is_kept_at_no_cost() {
        for (v0, ahead) in [(2.0, (2.0_f64 / 3.0).ln()), (0.5, (4.0_f64 / 3.0).ln())] {
            for depth in [40.0, 1e3, 1e9] {
                let problem = staged(1.0, v0, depth, &[stage(-1.0, 0.0, 1.0, f64::INFINITY)]);
                let flight = Energy::new().fly(&problem, Detail::End).unwrap();
                let time = depth + ahead;
                assert!((flight.end.time / time - 1.0).abs() < 1e-13, "{v0}, {depth:e}: {:e}", flight.end.time - time);
                assert!((flight.end.velocity - 1.0).abs() < 1e-15, "{v0}, {depth:e}: {:e}", flight.end.velocity);
                assert!(flight.cost.steps < 200, "{v0}, {depth:e}: {:?}", flight.cost);
            }
        }
    }

    /// w = 2^-53 is left at 1 m, and takes 2^-53 m more, which is less than depths can tell apart.
    #[test]
    fn a_rest_that_rounds_onto_a_boundary_has_its_time_beyond_it() {
        let left = 2.0_f64.powi(-53);
        let stages = [stage(0.5 * (1.0 - left), 0.0, 0.0, 1.0), stage(0.5, 0.0, 0.0, f64::INFINITY)];
        let flight = Energy::new().fly(&staged(1.0, 1.0, f64::INFINITY, &stages), Detail::Events).unwrap();
        let v1 = left.sqrt();
        assert_eq!((flight.end.depth, flight.outcome), (1.0, Outcome::Stopped));
        let (before, after) = (flight.events[0].state.time, flight.end.time - flight.events[0].state.time);
        assert!((before * 0.5 * (1.0 + v1) - 1.0).abs() < 1e-14, "{before}");
        assert!((after / (2.0 * v1) - 1.0).abs() < 1e-7, "{after:e}");
    }

    /// `dX/dV0 = M V0 e^(-κ X)/(p + s X)` from the energy at X, in one stage; behind another M V0 over the force there.
    #[test]
    fn the_depth_of_rest_moves_with_the_impact_speed() {
        let derived = |problem: Problem| {
            let mut dual = problem.cast::<Dual64>();
            dual.impact_speed = dual.impact_speed.derivative();
            Energy::new().fly_in(&dual, Detail::End).unwrap().end.depth
        };
        for (p, s, q) in [(2.0, 30.0, 0.7), (0.0, 30.0, 0.0), (-3.0, 30.0, 0.4), (5.0, 0.0, 0.6)] {
            let depth = derived(staged(1.0, 5.0, f64::INFINITY, &[stage(p, s, q, f64::INFINITY)]));
            let exact = 5.0 * (-2.0 * q * depth.re).exp() / (p + s * depth.re);
            assert!((depth.eps / exact - 1.0).abs() < 1e-13, "{p}, {s}, {q}: {:e} {exact:e}", depth.eps);
        }
        // As above, nearer to the boundary than depths can tell apart.
        let first = stage(0.5 * (1.0 - 2.0_f64.powi(-53)), 0.0, 0.0, 1.0);
        let depth = derived(staged(1.0, 1.0, f64::INFINITY, &[first, stage(500.0, 0.0, 0.0, f64::INFINITY)]));
        assert!(depth.re == 1.0 && (depth.eps * 500.0 - 1.0).abs() < 1e-13, "{depth:?}");
    }

    /// `w = 4 e^-x - 1`, over four drag lengths, where a tangent leads out of the bracket; and a stage of every term, in
    /// which halving would take five times the work. A trial is a sum of some 20 terms.
    #[test]
    fn the_root_of_w_is_found_in_few_trials() {
        let mut walk = Walk::from_impact();
        let root = walk.root(&loss(1.0, 0.0, 1.0), 0.0, 3.0, 4.0, 1e-18);
        assert!((root / 4.0_f64.ln() - 1.0).abs() < 1e-15, "{root}");
        assert!(walk.cost.force_evaluations <= 150, "{:?}", walk.cost);
        let problem = staged(1.0, 5.0, f64::INFINITY, &[stage(2.0, 30.0, 0.7, f64::INFINITY)]);
        let cost = Energy::new().fly(&problem, Detail::End).unwrap().cost;
        assert!(cost.force_evaluations <= 210, "{cost:?}");
    }

    #[test]
    fn a_bar_or_a_time_beyond_all_numbers_is_an_error() {
        // w = 1 + 0.6e308 behind a drive of 1.2e308 that fades; the sum of the magnitudes is beyond f64.
        let problem = staged(2.0, 1.0, 1.0, &[stage(-1.2e308, 1.2e308, 0.0, f64::INFINITY)]);
        let error = Energy::new().exit_margin_in(&problem).unwrap_err();
        assert!(matches!(error, IntegrationError::NotFinite { what: "V²", .. }), "{error}");
        // 1e305 m at 1e-5 m/s.
        let stages = [stage(0.5 * (1.0 - 1e-10), 0.0, 0.0, 1.0), stage(0.0, 0.0, 0.0, f64::INFINITY)];
        let error = Energy::new().fly(&staged(1.0, 1.0, 1e305, &stages), Detail::End).unwrap_err();
        assert!(matches!(error, IntegrationError::NotFinite { what: "time or speed", .. }), "{error}");
    }

    /// `tolerance^(1/n)` of the radius, n the last order of which a coefficient is left.
    #[test]
    fn a_step_in_time_follows_the_last_two_coefficients() {
        let leg = Leg { loss: loss(1.0, 0.0, 0.0), index: 0, tolerance: 1e-12 };
        let length = |last: f64, before: f64| {
            let mut series = [3.0; TIME_ORDER];
            series[TIME_ORDER - 1] = last;
            series[TIME_ORDER - 2] = before;
            leg.step_length(&series, 1.0)
        };
        for (last, before, expected) in [
            (3.0, 3.0, 1e-12_f64.powf(1.0 / 22.0)),
            (3.0, 0.0, 1e-12_f64.powf(1.0 / 23.0)),
            (0.0, -3.0, 1e-12_f64.powf(1.0 / 22.0)),
        ] {
            let (found, done) = length(last, before);
            assert!((found / expected - 1.0).abs() < 1e-14 && !done, "{last}, {before}: {found}");
        }
        assert_eq!(length(0.0, 0.0), (1.0, true));
    }

    /// The walk and the clock differ by rounding: where no way is left no time passes, and a way left at the last speed is
    /// flown at it.
    #[test]
    fn a_clock_that_comes_to_its_end_too_early_goes_on_at_the_last_speed() {
        let problem = staged(1.0, 1.0, 3.0, &[stage(0.5, 0.0, 0.0, f64::INFINITY)]);
        let elapse = |steady, depth, velocity| {
            let leg = Leg { loss: loss(steady, 0.0, 0.0), index: 0, tolerance: f64::EPSILON };
            let now = State { time: 2.0, depth: 1.0, velocity: 0.5 };
            leg.elapse(now, depth, velocity, &mut Log::new(&problem, Detail::End)).unwrap()
        };
        let slower = 0.5_f64.next_down();
        assert_eq!(elapse(-1.0, 1.0, slower), State { time: 2.0, depth: 1.0, velocity: slower });
        assert_eq!(elapse(1e-3, 3.0, 0.5), State { time: 6.0, depth: 3.0, velocity: 0.5 });
    }

    /// Steps as measured: the variable that is not chosen takes more, by one part in a hundred over scenes as varied as
    /// these.
    #[test]
    fn the_variable_of_time_is_the_one_that_takes_less_steps() {
        let mut random = Random(10);
        let (mut concrete, mut any) = (Cost::default(), Cost::default());
        for _ in 0..300 {
            concrete += Energy::new().fly(&random.scene(true), Detail::End).unwrap().cost;
            any += Energy::new().fly(&general(&mut random), Detail::End).unwrap().cost;
        }
        assert!(concrete.steps <= 3450 && any.steps <= 2472, "{concrete:?}, {any:?}");
    }
}
