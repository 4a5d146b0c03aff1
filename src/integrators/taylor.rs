//! Which flight follows from the equation of motion itself, to round-off? Adaptive Taylor series of high order.
//!
//! ```text
//! M V' = -(p + s x + r V + q V²),  x' = V        in one stage
//! v[k+1] = -(p [k=0] + s x[k] + r v[k] + q sum over i of v[i] v[k-i]) / (k+1),   x[k+1] = v[k]/(k+1)
//! ```
//!
//! A stage is one smooth problem: the series never crosses a boundary, and starts anew from the exact depth of the
//! boundary. Places of rest and passage come from the polynomials of the step ([`super::locate`], with the proofs).
//!
//! **Units of a step.** Each step is computed in its own units of time and velocity, powers of two near the present
//! velocity and the shortest time scale of the stage. Scaling by them rounds nothing, every coefficient is of order
//! one, and scenes of any magnitude, in `f32` as well, run the same way.
//!
//! **Step.** Truncating after order K leaves about `|v[K]| h^K`, so `h` makes that `tolerance` times the velocity, for
//! the last two orders: every second coefficient may vanish (theory section 2). The series of the tunnel has its
//! nearest pole on the real axis, in the past, and the coefficients see it. The series of a stage without drag is
//! entire: its step is capped by `w h <= 1.8`, so that no oscillation hides inside (proof 3 of [`super::locate`]).
//!
//! **Work.** Drag costs a convolution, half of it by symmetry, with the factor of `v[k]` taken out of the sum (it is
//! `r + 2 q v[0]`, so viscosity is free). Without drag the recurrence has two terms, and for a constant force the
//! series ends. Which of these holds is decided once per stage.
//!
//! Source of the step rule: Jorba, Zou (2005), A software package for the numerical integration of ODEs by means of
//! high-order Taylor methods, Experimental Mathematics 14, section 3.

use super::locate::{self, Found};
use super::outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Sample};
use crate::physics::exit_energy;
use crate::physics::{Event, EventKind, Outcome, Problem, Scalar, Stage, State};

/// Steps allowed for one flight. A resisting scene takes two to a few dozen; a stiff driven one thousands.
const STEPS_MAX: u64 = 100_000;

/// Largest `w h` of a step, `w² = s/M`: more than the quarter period to rest, `pi/2`, and less than the half period
/// `pi` in which V could vanish twice.
const PHASE_MAX: f64 = 1.8;

/// Longest step in its own unit of time. No flight needs more, and beyond it coefficients that underflow would count.
const SPAN_MAX: f64 = 64.0;

/// The Taylor integrator.
///
/// The default works to the round-off of the number type. A looser tolerance takes a lower order, for
/// work-precision comparisons.
///
/// # Example
/// ```
/// use penetrode::integrators::{Detail, Integrator, taylor::Taylor};
/// use penetrode::physics::{Outcome, Problem, Stage, Target};
///
/// // Constant resistance: X = M V0²/(2 P), T = M V0/P.
/// let problem = Problem {
///     mass: 2.0,
///     impact_speed: 300.0,
///     exit_depth: f64::INFINITY,
///     stages: [Stage::tunnel(1.0e6, 0.0)].into_iter().collect(),
///     crater: None,
///     target: Target::CraterAndTunnel,
/// };
/// let flight = Taylor::default().fly(&problem, Detail::Events)?;
/// assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
/// assert!((flight.end.depth - 0.09).abs() < 1e-16);
/// assert!((flight.end.time - 0.0006).abs() < 1e-18);
/// # Ok::<(), penetrode::integrators::IntegrationError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taylor {
    /// Truncation error allowed in one step, relative to the velocity there; `None`: round-off of the number type.
    tolerance: Option<f64>,
}

impl Taylor {
    /// A Taylor integrator whose errors stay near `rtol` (relative; times and velocities, the depth is better).
    ///
    /// # Errors
    /// [`IntegrationError::BadOption`] unless `rtol` lies in 0 (round-off) to 0.1.
    pub fn with_rtol(rtol: f64) -> Result<Self, IntegrationError> {
        if !(0.0..=0.1).contains(&rtol) {
            return Err(IntegrationError::BadOption {
                option: "rtol",
                value: rtol.to_string(),
                allowed: "a number from 0 (round-off) to 0.1",
            });
        }
        Ok(Self { tolerance: Some(rtol) })
    }

    /// Truncation error of one step relative to the velocity, in the number type `S`.
    pub fn tolerance_in<S: Scalar>(&self) -> f64 {
        // A flight takes a few steps and adds up their errors; half a rounding unit each stays below the rounding.
        self.tolerance.map_or(0.0, |rtol| 0.25 * rtol).max(0.5 * S::EPSILON)
    }

    /// Flies `problem` in the number type `S`. See [`Integrator::fly`].
    ///
    /// In dual numbers the derivative parts of the end state are those of the event: its time and place move with
    /// the parameter, as they should. Boundaries are compared by value.
    ///
    /// # Errors
    /// [`IntegrationError::NeverEnds`] where nothing stops the projectile and no exit is reached,
    /// [`IntegrationError::StepBudgetSpent`] after 100,000 steps, [`IntegrationError::NotFinite`].
    pub fn fly_in<S: Scalar>(&self, problem: &Problem<S>, detail: Detail) -> Result<Flight<S>, IntegrationError> {
        if let Some(mut flight) = Flight::at_once(problem) {
            if detail == Detail::End {
                flight.events.clear();
            }
            return Ok(flight);
        }
        let tolerance = self.tolerance_in::<S>();
        // Least work near order -ln(tolerance)/2 where a coefficient costs a convolution; two-term recurrences
        // (second number) may go further and cross a crater in one step.
        if tolerance > 1e-5 {
            Course::<S, 8, 10>::new(problem, tolerance, detail).fly()
        } else if tolerance > 1e-9 {
            Course::<S, 12, 14>::new(problem, tolerance, detail).fly()
        } else if tolerance > 1e-13 {
            Course::<S, 16, 18>::new(problem, tolerance, detail).fly()
        } else if tolerance > 1e-17 {
            Course::<S, 20, 24>::new(problem, tolerance, detail).fly()
        } else {
            Course::<S, 40, 48>::new(problem, tolerance, detail).fly()
        }
    }

    /// What the scene let this flight skip, and how each stage was treated: one sentence each, for people.
    pub fn explain(&self, problem: &Problem, flight: &Flight) -> Vec<String> {
        let mut lines = Vec::new();
        for (index, law) in problem.stages.iter().enumerate() {
            let shape = match Shape::of(law) {
                Shape::Constant => "constant force: the series ends, one step serves",
                Shape::Linear => "no drag: recurrence of two terms, no convolution",
                Shape::Drag => "no stiffness: V monotone, no search for hidden roots",
                Shape::General => "stiffness and drag: earliest root isolated on every step",
            };
            lines.push(if index <= flight.stage {
                format!("stage {index}: {shape}")
            } else {
                format!("stage {index}: never entered, no force evaluated")
            });
        }
        if !problem.has_exit() {
            lines.push("exit: none in a semi-infinite target, no passage sought".to_owned());
        } else if flight.outcome.is_stop() && problem.stages[flight.stage].end < problem.exit_depth {
            lines.push("exit: in a stage never entered, no passage sought".to_owned());
        }
        if flight.trajectory.is_empty() {
            lines.push("trajectory: not asked for, not stored".to_owned());
        }
        lines.push("Jacobian: an explicit method needs none".to_owned());
        lines.push("sensitivities: not asked for, no derivatives carried".to_owned());
        lines
    }
}

impl Integrator for Taylor {
    fn name(&self) -> &'static str {
        "taylor"
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        self.fly_in(problem, detail)
    }
}

/// Which terms a stage has, and with them which recurrence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// p alone: V is linear in t.
    Constant,
    /// p, s, r: linear.
    Linear,
    /// p, r, q: autonomous in V, a Riccati equation.
    Drag,
    /// s and q.
    General,
}

impl Shape {
    #[inline(always)]
    fn of<S: Scalar>(law: &Stage<S>) -> Self {
        match (law.stiffness.value() == 0.0, law.drag.value() == 0.0) {
            (true, true) if law.viscosity.value() == 0.0 => Self::Constant,
            (_, true) => Self::Linear,
            (true, false) => Self::Drag,
            (false, false) => Self::General,
        }
    }
}

/// `1/k` for the recurrences, correctly rounded to `f64`.
const RECIPROCALS: [f64; 64] = {
    let mut table = [0.0; 64];
    let mut k = 1;
    while k < 64 {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

/// `1/k` in the number type: from the table unless the type is finer than `f64`.
#[inline(always)]
fn reciprocal<S: Scalar>(k: usize) -> S {
    if S::EPSILON < f64::EPSILON { S::one() / S::from_f64(k as f64) } else { S::from_f64(RECIPROCALS[k]) }
}

/// The polynomials of one step, in the units of the step: coefficients of V and of depth/time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series<S, const K: usize> {
    /// `V(t) = sum of velocity[k] t^k`.
    velocity: [S; K],
    /// `x(t) = t sum of advance[k] t^k`, `advance[k] = velocity[k]/(k+1)`.
    advance: [S; K],
}

impl<S: Scalar, const K: usize> Series<S, K> {
    /// The first K coefficients of V and of x for unit mass, from `x = 0` and V = `velocity`.
    ///
    /// `SPRING` and `DRAG` say whether `s` and `q` may differ from zero. With `g = r + 2 q v[0]`,
    ///
    /// ```text
    /// v[k+1] = -(g v[k] + s v[k-1]/k + q (2 sum over 0 < i < k/2 of v[i] v[k-i] + [k even] v[k/2]²)) / (k+1)
    /// ```
    ///
    /// so the longest chain of dependent operations is one product and one sum a coefficient.
    #[inline(always)]
    pub(crate) fn new<const SPRING: bool, const DRAG: bool>(law: &Stage<S>, velocity: S) -> Self {
        let mut v = [S::zero(); K];
        let mut advance = [S::zero(); K];
        let qv = law.drag * velocity;
        let gradient = law.viscosity + qv + qv;
        let twice_drag = law.drag + law.drag;
        v[0] = velocity;
        advance[0] = velocity;
        v[1] = -(law.static_force + (law.viscosity + qv) * velocity);
        for k in 1..K - 1 {
            advance[k] = v[k] * reciprocal(k + 1);
            let mut rest = S::zero();
            if SPRING {
                rest = law.stiffness * advance[k - 1];
            }
            if DRAG {
                let mut sum = S::zero();
                for i in 1..k.div_ceil(2) {
                    sum += v[i] * v[k - i];
                }
                rest += twice_drag * sum;
                if k % 2 == 0 {
                    rest += law.drag * (v[k / 2] * v[k / 2]);
                }
            }
            v[k + 1] = -((gradient * v[k] + rest) * reciprocal(k + 1));
        }
        advance[K - 1] = v[K - 1] * reciprocal(K);
        Self { velocity: v, advance }
    }

    /// Longest step whose truncation error is about `tolerance` times the velocity, by the last two orders.
    ///
    /// `h = (tolerance v[0]/|v[k]|)^(1/k)`, the less for k = K-1 and K-2. The logarithms are read off the bits of the
    /// numbers (12 % at worst, 1 % of `h` after the root); the power is biased to the short side, by up to 6 %.
    #[inline(always)]
    pub(crate) fn span(&self, tolerance: f64) -> f64 {
        let goal = rough_log2(tolerance * self.velocity[0].value());
        let last = (goal - rough_log2(self.velocity[K - 1].value())) * (1.0 / (K - 1) as f64);
        let before = (goal - rough_log2(self.velocity[K - 2].value())) * (1.0 / (K - 2) as f64);
        rough_exp2(last.min(before)).min(SPAN_MAX)
    }

    /// Depth and velocity at `time`, together; four interleaved Horner chains each, to shorten the dependency.
    #[inline(always)]
    pub(crate) fn at(&self, time: f64) -> State<S> {
        let t = S::from_f64(time);
        let t2 = t * t;
        let t4 = t2 * t2;
        let zero = S::zero();
        let (mut v, mut a) = ([zero; 4], [zero; 4]);
        for block in (0..K.div_ceil(4)).rev() {
            for lane in 0..4 {
                let k = 4 * block + lane;
                if k < K {
                    v[lane] = v[lane] * t4 + self.velocity[k];
                    a[lane] = a[lane] * t4 + self.advance[k];
                }
            }
        }
        let velocity = (v[0] + t2 * v[2]) + t * (v[1] + t2 * v[3]);
        let advance = (a[0] + t2 * a[2]) + t * (a[1] + t2 * a[3]);
        State { time: t, depth: t * advance, velocity }
    }

    /// Values of the coefficients of V.
    fn velocity_values(&self) -> [f64; K] {
        self.velocity.map(Scalar::value)
    }
}

/// `log2 |x|` plus the exponent bias, 0 to 0.087 too small: exponent and significand read as one number.
#[inline(always)]
fn rough_log2(x: f64) -> f64 {
    x.abs().to_bits() as i64 as f64 * (1.0 / (1_u64 << 52) as f64)
}

/// `2^y` times a factor from 0.94 to 1, for -1000 < y; at most `2^1000`.
#[inline(always)]
fn rough_exp2(y: f64) -> f64 {
    let bits = (y.clamp(-1000.0, 1000.0) + 1023.0) * (1_u64 << 52) as f64;
    0.94 * f64::from_bits(bits as i64 as u64)
}

/// The power of two at or below a positive number (the least normal number for what is smaller).
#[inline(always)]
fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.max(f64::MIN_POSITIVE).min(0.5 * f64::MAX).to_bits() & (0x7ff << 52))
}

/// What ended a step.
enum Step<S> {
    /// Nothing: the flight goes on from its end.
    Whole(State<S>),
    /// The end of the stage or the exit depth.
    Limit(State<S>),
    /// V = 0 before that.
    Rest(State<S>),
}

/// A flight in progress; orders `K - 1` with drag and `L - 1` without.
struct Course<'a, S, const K: usize, const L: usize> {
    problem: &'a Problem<S>,
    detail: Detail,
    tolerance: f64,
    /// Longest last correction of an event in units of the step: its neglected terms are of fourth order.
    closing: f64,
    state: State<S>,
    stage: usize,
    events: Events<S>,
    trajectory: Vec<Sample>,
    cost: Cost,
    /// Error bar of `W/V0²` so far.
    bar: f64,
    /// Least `V/V0` at the stage ends passed so far, and the greatest bar there.
    least_at_ends: f64,
    bar_at_ends: f64,
}

impl<'a, S: Scalar, const K: usize, const L: usize> Course<'a, S, K, L> {
    fn new(problem: &'a Problem<S>, tolerance: f64, detail: Detail) -> Self {
        Self {
            problem,
            detail,
            tolerance,
            closing: tolerance.sqrt().sqrt(),
            state: State::at_impact(problem),
            stage: 0,
            events: Events::new(),
            trajectory: Vec::new(),
            cost: Cost::default(),
            bar: 0.0,
            least_at_ends: f64::INFINITY,
            bar_at_ends: 0.0,
        }
    }

    fn fly(mut self) -> Result<Flight<S>, IntegrationError> {
        self.record();
        loop {
            // Stages without length are passed where they stand. The last stage has no end.
            self.pass_ends();
            let at_rest = self.cross_stage()?;
            if !at_rest {
                // At the limit of the stage. It may be the exit, the end of the stage, or both.
                let entered = self.stage;
                self.pass_ends();
                let exit = self.state.depth.value() >= self.problem.exit_depth.value();
                let stopped = self.state.velocity.value() <= 0.0;
                if exit {
                    self.push(EventKind::Exit);
                }
                if stopped {
                    self.push(EventKind::Rest);
                }
                if exit || stopped {
                    self.stage = entered;
                    return Ok(self.finish(exit));
                }
            } else {
                self.push(EventKind::Rest);
                return Ok(self.finish(false));
            }
        }
    }

    /// Lists the stage ends at the present depth and enters the stage beyond them.
    #[inline(always)]
    fn pass_ends(&mut self) {
        while self.problem.stages[self.stage].end.value() <= self.state.depth.value() {
            self.push(EventKind::boundary(self.problem, self.stage));
            let relative = self.state.velocity.value() / self.problem.impact_speed.value();
            self.least_at_ends = self.least_at_ends.min(relative);
            self.bar_at_ends = self.bar_at_ends.max(self.bar);
            self.stage += 1;
        }
    }

    #[inline(always)]
    fn push(&mut self, kind: EventKind) {
        if self.detail >= Detail::Events {
            self.events.push(Event { kind, state: self.state });
            self.record();
        }
    }

    #[inline(always)]
    fn record(&mut self) {
        if self.detail >= Detail::Trajectory {
            self.record_sample();
        }
    }

    #[cold]
    fn record_sample(&mut self) {
        let State { depth, velocity, .. } = self.state;
        self.trajectory.push(Sample {
            state: self.state.values(),
            force: self.problem.stages[self.stage].force(depth, velocity).value(),
            stage: self.stage,
        });
    }

    /// Steps through the present stage to its limit (false) or to rest (true).
    #[inline(always)]
    fn cross_stage(&mut self) -> Result<bool, IntegrationError> {
        let law = &self.problem.stages[self.stage];
        if law.static_force.value() <= 0.0 {
            self.refuse_endless(law)?;
        }
        match Shape::of(law) {
            Shape::Constant => self.step_through::<4, false, false>(),
            Shape::Linear => self.step_through::<L, true, false>(),
            Shape::Drag => self.step_through::<K, false, true>(),
            Shape::General => self.step_through::<K, true, true>(),
        }
    }

    fn step_through<const N: usize, const SPRING: bool, const DRAG: bool>(&mut self) -> Result<bool, IntegrationError> {
        let problem = self.problem;
        let stage = &problem.stages[self.stage];
        let limit = problem.limit_of(self.stage);
        // Coefficients per unit mass, once a stage.
        let static_force = stage.static_force / problem.mass;
        let stiffness = stage.stiffness / problem.mass;
        let viscosity = stage.viscosity / problem.mass;
        let drag = stage.drag / problem.mass;
        let frequency = if SPRING { stiffness.value().sqrt() } else { 0.0 };
        // Only a driven stage with both springs and dashpots can creep towards its equilibrium for ever.
        let may_creep = SPRING && stage.static_force.value() < 0.0 && viscosity.value() >= 2.0 * frequency;
        let steps_before = self.cost.steps;

        while self.cost.steps < STEPS_MAX {
            // Units: velocity and time, powers of two. The time is the shortest of V/|a|, M/r, M/(q V), 1/w, or,
            // where no force acts, the way to the limit.
            let State { time, depth, velocity } = self.state;
            let at_start = static_force + stiffness * depth;
            let speed = velocity.value();
            let rate = at_start.value().abs() + speed * (viscosity.value() + drag.value() * speed + frequency);
            let scale = if rate > 0.0 { speed / rate } else { (limit.value() - depth.value()) / speed };
            let unit_velocity = power_of_two_below(speed);
            let unit_time = power_of_two_below(scale);
            let unit_depth = unit_velocity * unit_time;
            let law = Stage {
                static_force: at_start * S::from_f64(unit_time / unit_velocity),
                stiffness: if SPRING { stiffness * S::from_f64(unit_time * unit_time) } else { S::zero() },
                viscosity: viscosity * S::from_f64(unit_time),
                drag: if DRAG { drag * S::from_f64(unit_depth) } else { S::zero() },
                end: (limit - depth) * S::from_f64(1.0 / unit_depth),
            };
            if may_creep {
                self.refuse_creep(stage, limit.value())?;
            }
            let start =
                State { time: S::zero(), depth: S::zero(), velocity: velocity * S::from_f64(1.0 / unit_velocity) };

            let series = Series::<S, N>::new::<SPRING, DRAG>(&law, start.velocity);
            self.cost.steps += 1;
            self.cost.force_evaluations += if SPRING || DRAG { N as u64 - 1 } else { 1 };
            let span = if SPRING || DRAG { series.span(self.tolerance) } else { f64::INFINITY };
            let span = if SPRING { span.min(PHASE_MAX / (frequency * unit_time)) } else { span };
            let step = if SPRING && DRAG {
                search_certified(&law, &series, start, span, self.closing)
            } else {
                search(&law, &series, start, span, self.closing)
            };

            let (Step::Whole(local) | Step::Limit(local) | Step::Rest(local)) = step;
            let new_depth =
                if matches!(step, Step::Limit(_)) { limit } else { depth + local.depth * S::from_f64(unit_depth) };
            let next = State {
                time: time + local.time * S::from_f64(unit_time),
                depth: new_depth,
                velocity: local.velocity * S::from_f64(unit_velocity),
            };
            if !(next.time.value().is_finite() && next.depth.value().is_finite() && next.velocity.value().is_finite()) {
                return Err(IntegrationError::NotFinite { what: "the state", last: self.state.values() });
            }
            self.widen_bar(&law, &start, &local, unit_velocity, next.depth.value() / unit_depth);
            self.state = next;
            match step {
                Step::Whole(_) => self.record(),
                Step::Limit(_) => return Ok(false),
                Step::Rest(_) => return Ok(true),
            }
        }
        debug_assert!(self.cost.steps >= steps_before);
        Err(IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, last: self.state.values() })
    }

    /// Adds the error of one step to the bar of `W/V0²`, in energy over depth, where it never grows:
    ///
    /// ```text
    /// d(dW)/dx = -(r/V + 2 q) dW/M,  so  dW -> dW/(1 + r t/M + 2 q x/M) at most over the step
    /// ```
    ///
    /// A step adds `2 V dV` for the rounding (and truncation) of V, and `2 F dx/M` for that of x, which is rounded
    /// relative to the whole depth, and for that of the force, which acts over the way of the step.
    #[inline(always)]
    fn widen_bar(&mut self, law: &Stage<S>, start: &State<S>, end: &State<S>, unit_velocity: f64, depth: f64) {
        let (v0, v1) = (start.velocity.value(), end.velocity.value());
        let fastest = v0.max(v1);
        let way = end.depth.value();
        let (r, q) = (law.viscosity.value(), law.drag.value());
        let force = law.static_force.value().abs() + law.stiffness.value() * way + (r + q * fastest) * fastest;
        let relative = unit_velocity / self.problem.impact_speed.value();
        let unit = S::EPSILON.max(f64::EPSILON) + 2.0 * self.tolerance;
        let added = unit * (4.0 * fastest * fastest + 2.0 * force * (depth + 2.0 * way));
        self.bar = self.bar / (1.0 + r * end.time.value() + 2.0 * q * way) + relative * relative * added;
    }

    #[inline(always)]
    fn finish(self, through: bool) -> Flight<S> {
        let problem = self.problem;
        let (margin, bar) = if !problem.has_exit() {
            (None, None)
        } else if through {
            let least = self.least_at_ends.min(self.state.velocity.value() / problem.impact_speed.value());
            (Some(least * least), Some(self.bar.max(self.bar_at_ends)))
        } else {
            let scale = problem.impact_speed.value();
            let beyond = exit_energy::energy_beyond_stop(problem, self.stage, self.state.depth.value());
            (Some(beyond / scale / scale), Some(self.bar))
        };
        let undecided = matches!((margin, bar), (Some(m), Some(b)) if !(m.abs() > b));
        let outcome = if undecided {
            Outcome::Undecided
        } else if through {
            Outcome::Perforated
        } else {
            problem.stop_in(self.stage)
        };
        Flight {
            outcome,
            stage: self.stage,
            end: self.state,
            events: self.events,
            exit_margin: margin,
            exit_margin_error: bar,
            cost: self.cost,
            trajectory: self.trajectory,
            step_limit: None,
            notes: Vec::new(),
        }
    }

    /// Error where the stage entered without a resisting static force neither stops the projectile nor lets it out.
    #[cold]
    fn refuse_endless(&self, law: &Stage<S>) -> Result<(), IntegrationError> {
        let never = |why| Err(IntegrationError::NeverEnds { why, last: self.state.values() });
        if law.stiffness.value() > 0.0 {
            // A spring stops everything but a creep, which is judged while it goes on.
            return Ok(());
        }
        let way = self.problem.limit_of(self.stage).value() - self.state.depth.value();
        if way == f64::INFINITY {
            return never(if law.static_force.value() < 0.0 {
                "the last stage drives the projectile and has no far side"
            } else if law.viscosity.value() == 0.0 && law.drag.value() == 0.0 {
                "the last stage has no resistance and no far side"
            } else {
                "resistance vanishes with the velocity and there is no far side"
            });
        }
        if law.static_force.value() == 0.0 && law.viscosity.value() > 0.0 {
            // dV/dx = -(r + q V)/M: V vanishes at the depth (M/q) ln(1 + q V/r), which is only approached.
            let (mass, speed) = (self.problem.mass.value(), self.state.velocity.value());
            let ratio = law.drag.value() * speed / law.viscosity.value();
            let log_over = if ratio == 0.0 { 1.0 } else { ratio.ln_1p() / ratio };
            if mass * speed / law.viscosity.value() * log_over <= way {
                return never("a resistance that vanishes with the velocity brings it to nothing before the boundary");
            }
        }
        Ok(())
    }

    /// Error where an overdamped driven stage has trapped the projectile before its equilibrium `x = -p/s`.
    ///
    /// With `u = x + p/s < 0` and `l = r/(2M) + sqrt((r/(2M))² - s/M)`, the lines `V = 0` and `V = -l u` cannot be
    /// crossed outwards (drag only helps), so from between them u = 0 is approached for ever.
    #[cold]
    fn refuse_creep(&self, law: &Stage<S>, limit: f64) -> Result<(), IntegrationError> {
        let mass = self.problem.mass.value();
        let equilibrium = -law.static_force.value() / law.stiffness.value();
        let missing = equilibrium - self.state.depth.value();
        let half = 0.5 * law.viscosity.value() / mass;
        let rate = half + (half * half - law.stiffness.value() / mass).max(0.0).sqrt();
        if limit >= equilibrium && missing > 0.0 && self.state.velocity.value() <= rate * missing {
            return Err(IntegrationError::NeverEnds {
                why: "viscosity lets it only creep towards the depth where the spring balances the drive",
                last: self.state.values(),
            });
        }
        Ok(())
    }
}

/// The event of a step on which the sign of V at the end tells whether V vanished (proofs 2 and 3 of `locate`).
#[inline(always)]
fn search<S: Scalar, const N: usize>(
    law: &Stage<S>,
    series: &Series<S, N>,
    start: State<S>,
    span: f64,
    closing: f64,
) -> Step<S> {
    let at = |time| series.at(time);
    // r, q >= 0 only take energy, so W at the limit is at most v² - (2 p + s D) D. One hundredth is left for rounding.
    let (v, way) = (start.velocity.value(), law.end.value());
    let cost = way * (2.0 * law.static_force.value() + law.stiffness.value() * way);
    let within_reach = way < f64::INFINITY && cost < 1.01 * v * v;
    if within_reach {
        match locate::passage(law, at, start, span, false, closing) {
            Found::Inside(state) => return Step::Limit(state),
            Found::Beyond(state) => return Step::Whole(state),
            Found::RestFirst => {}
        }
    }
    match locate::rest(law, at, start, span, closing) {
        Found::Inside(rest) if within_reach && rest.depth.value() >= way => {
            through(locate::passage(law, at, rest, rest.time.value(), true, closing))
        }
        Found::Inside(rest) => Step::Rest(rest),
        Found::Beyond(end) if within_reach && end.depth.value() >= way => {
            through(locate::passage(law, at, end, span, true, closing))
        }
        Found::Beyond(end) => Step::Whole(end),
        Found::RestFirst => Step::Whole(at(span)),
    }
}

/// The event of a step on which nothing is known of V: its earliest root is isolated first (proof 4 of `locate`).
fn search_certified<S: Scalar, const N: usize>(
    law: &Stage<S>,
    series: &Series<S, N>,
    start: State<S>,
    span: f64,
    closing: f64,
) -> Step<S> {
    let at = |time| series.at(time);
    let way = law.end.value();
    match locate::first_root(&series.velocity_values(), span) {
        Some(root) => {
            // The root is isolated; correct it in the number type, from the nearest trial.
            let rest = match locate::rest(law, at, at(root), span, closing) {
                Found::Inside(rest) => rest,
                _ => State { velocity: S::zero(), ..at(root) },
            };
            if rest.depth.value() >= way {
                return through(locate::passage(law, at, rest, rest.time.value(), true, closing));
            }
            Step::Rest(rest)
        }
        None => {
            let end = at(span);
            if end.depth.value() >= way {
                return through(locate::passage(law, at, end, span, true, closing));
            }
            Step::Whole(end)
        }
    }
}

/// A passage that is known to lie inside the step.
#[inline(always)]
fn through<S: Scalar>(found: Found<S>) -> Step<S> {
    match found {
        Found::Inside(state) => Step::Limit(state),
        Found::Beyond(state) => Step::Whole(state),
        // `passage` gives up only when it does not know that the boundary is reached.
        Found::RestFirst => unreachable!("a boundary known to be reached was given up"),
    }
}
