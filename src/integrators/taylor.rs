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

#![expect(clippy::inline_always, reason = "measured: one flight is one function, 1.3 times faster than with calls")]

use std::cmp::Ordering;

use super::locate::{self, Closing, Found};
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

/// Most coefficients that are computed without a loop.
const UNROLLED_MAX: usize = 24;

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
        // What is neglected is smaller than the last term kept, which is made equal to this: by a factor of six at the
        // usual ratio of step and radius. Measured over random scenes, the errors then stay below `rtol`.
        self.tolerance.map_or(0.0, |rtol| 2.0 * rtol).max(S::EPSILON)
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
            Course::<S, 12, 18>::new(problem, tolerance, detail).fly()
        } else if tolerance > 1e-13 {
            Course::<S, 16, 20>::new(problem, tolerance, detail).fly()
        } else if tolerance > 1e-17 {
            Course::<S, 22, 24>::new(problem, tolerance, detail).fly()
        } else {
            Course::<S, 40, 48>::new(problem, tolerance, detail).fly()
        }
    }

    /// How each stage of `flight` was treated: one sentence each, for people.
    pub fn explain(problem: &Problem, flight: &Flight) -> Vec<String> {
        let treatment = |law: &Stage| match Shape::of(law) {
            Shape::Constant => "constant force: the series ends, one step serves",
            Shape::Spring => "a spring alone: recurrence of one term, no convolution",
            Shape::Linear => "no drag: recurrence of two terms, no convolution",
            Shape::Drag => "no stiffness: V monotone, no search for hidden roots",
            Shape::General => "stiffness and drag: earliest root isolated on every step",
        };
        let flown = problem.stages.iter().take(flight.stage + 1);
        flown.enumerate().map(|(index, law)| format!("stage {index}: {}", treatment(law))).collect()
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
    /// p, s: linear, and every second coefficient follows from the one before it alone.
    Spring,
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
            (false, true) if law.viscosity.value() == 0.0 => Self::Spring,
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
    if S::EPSILON < f64::EPSILON { S::one().over(S::from_f64(k as f64)) } else { S::from_f64(RECIPROCALS[k]) }
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
    /// `SPRING`, `DRAG` and `DAMPED` say whether `s`, `q` and `r` may differ from zero (with drag, r always may).
    /// With `g = r + 2 q v[0]`,
    ///
    /// ```text
    /// v[k+1] = -(g v[k] + s v[k-1]/k + 2 q (sum over 0 < i < k/2 of v[i] v[k-i] + [k even] v[k/2]²/2)) / (k+1)
    /// ```
    ///
    /// arranged so that the longest chain of dependent operations is one product and one sum a coefficient.
    #[inline(always)]
    pub(crate) fn new<const SPRING: bool, const DRAG: bool, const DAMPED: bool>(law: &Stage<S>, velocity: S) -> Self {
        let mut v = [S::zero(); K];
        let mut advance = [S::zero(); K];
        // 2 q v[i], so that a sum of products needs no factor afterwards.
        let mut pull = [S::zero(); K];
        let qv = law.drag * velocity;
        let twice_drag = law.drag + law.drag;
        let gradient = law.viscosity + qv + qv;
        v[0] = velocity;
        advance[0] = velocity;
        v[1] = -(law.static_force + (law.viscosity + qv) * velocity);
        // One coefficient. A macro, for with a literal k the sum below has a fixed length and needs no loop.
        macro_rules! coefficient {
            ($k:expr) => {{
                let k: usize = $k;
                let minus = -reciprocal::<S>(k + 1);
                advance[k] = v[k] * reciprocal(fault!("taylor-coefficient", k + 1, k + 2));
                let mut rest = S::zero();
                if DRAG {
                    pull[k] = twice_drag * v[k];
                    if k % 2 == 0 {
                        rest = S::from_f64(fault!("taylor-middle-term", 0.5, 1.0)) * (pull[k / 2] * v[k / 2]);
                    }
                    // The newest coefficient comes last: the rest of the sum is ready before it is.
                    for i in (1..k.div_ceil(2)).rev() {
                        rest += pull[i] * v[fault!("taylor-index", k - i, k - i - 1)];
                    }
                    rest = rest * minus;
                }
                if SPRING {
                    let spring = (law.stiffness * (minus * reciprocal(k))) * v[k - 1];
                    rest = if DRAG { rest + spring } else { spring };
                }
                v[k + 1] = if DRAG || DAMPED { rest + (gradient * minus) * v[k] } else { rest };
            }};
        }
        macro_rules! coefficients {
            ($($k:literal)*) => { $( if $k + 1 < K { coefficient!($k); } )* };
        }
        if K > UNROLLED_MAX || S::EPSILON < f64::EPSILON {
            for k in 1..K - 1 {
                coefficient!(k);
            }
        } else {
            // A loop over k would spend more on its bounds than on the sums.
            coefficients!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22);
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
    x.abs().to_bits().cast_signed() as f64 * (1.0 / (1_u64 << 52) as f64)
}

/// `2^y` times a factor from 0.94 to 1, for -1000 < y; at most `2^1000`.
#[inline(always)]
fn rough_exp2(y: f64) -> f64 {
    let bits = (y.clamp(-1000.0, 1000.0) + 1023.0) * (1_u64 << 52) as f64;
    0.94 * f64::from_bits((bits as i64).cast_unsigned())
}

/// The power of two at or below a positive number (the least normal number for what is smaller).
#[inline(always)]
fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.clamp(f64::MIN_POSITIVE, 0.5 * f64::MAX).to_bits() & (0x7ff << 52))
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
    /// When a trial for an event is the last.
    closing: Closing,
    state: State<S>,
    stage: usize,
    events: Events<S>,
    trajectory: Vec<Sample>,
    cost: Cost,
    /// Error bar of `W/V0²` so far.
    bar: f64,
    /// Least `W/V0²` at the stage ends passed so far.
    least_at_ends: Barred,
}

/// A value within an error bar.
#[derive(Clone, Copy)]
struct Barred {
    value: f64,
    bar: f64,
}

impl Barred {
    /// The lesser of the two. The bar of the greater counts as far as it reaches below that of the lesser.
    fn min(self, other: Self) -> Self {
        let (lesser, greater) = if self.value <= other.value { (self, other) } else { (other, self) };
        let bar = lesser.bar.max(greater.bar - (greater.value - lesser.value));
        Self { bar, ..lesser }
    }
}

impl<'a, S: Scalar, const K: usize, const L: usize> Course<'a, S, K, L> {
    fn new(problem: &'a Problem<S>, tolerance: f64, detail: Detail) -> Self {
        Self {
            problem,
            detail,
            tolerance,
            closing: Closing::new(tolerance),
            state: State::at_impact(problem),
            stage: 0,
            events: Events::new(),
            trajectory: Vec::new(),
            cost: Cost::default(),
            bar: 0.0,
            least_at_ends: Barred { value: f64::INFINITY, bar: 0.0 },
        }
    }

    fn fly(mut self) -> Result<Flight<S>, IntegrationError> {
        self.record();
        // Every round leaves a stage behind, or ends the flight.
        for _ in 0..=self.problem.stages.len() {
            // Stages without length are passed where they stand. The last stage has no end.
            self.pass_ends();
            let entered = self.stage;
            self.cross_stage()?;
            // At rest, or at the limit of the stage: its end, the exit, or both; touched or passed.
            self.pass_ends();
            let exit = self.state.depth.value() >= self.problem.exit_depth.value();
            let stopped = self.state.velocity.value() <= 0.0;
            if exit {
                self.push(fault!("events-swapped", EventKind::Exit, EventKind::Rest));
            }
            if stopped {
                self.push(EventKind::Rest);
            }
            if exit || stopped {
                self.stage = entered;
                return Ok(self.finish(exit));
            }
        }
        Err(IntegrationError::NeverEnds { why: "a stage was crossed and not left", last: self.state.values() })
    }

    /// `W/V0²` here.
    #[inline(always)]
    fn energy(&self) -> Barred {
        let relative = self.state.velocity.value() / self.problem.impact_speed.value();
        Barred { value: relative * relative, bar: self.bar }
    }

    /// Lists the stage ends at the present depth and enters the stage beyond them.
    #[inline(always)]
    fn pass_ends(&mut self) {
        while fault!(
            "stage-end-inclusive",
            self.problem.stages[self.stage].end.value() <= self.state.depth.value(),
            self.problem.stages[self.stage].end.value() < self.state.depth.value()
        ) {
            self.push(EventKind::boundary(self.problem, self.stage));
            self.least_at_ends = self.least_at_ends.min(self.energy());
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

    /// Steps through the present stage to its limit or to rest.
    #[inline(always)]
    fn cross_stage(&mut self) -> Result<(), IntegrationError> {
        let law = &self.problem.stages[self.stage];
        if law.static_force.value() <= 0.0 && self.is_lost_in_approach(law)? {
            return Ok(());
        }
        match Shape::of(law) {
            Shape::Constant => self.step_through::<4, false, false, false>(),
            Shape::Spring => self.step_through::<L, true, false, false>(),
            Shape::Linear => self.step_through::<L, true, false, true>(),
            Shape::Drag => self.step_through::<K, false, true, true>(),
            Shape::General => self.step_through::<K, true, true, true>(),
        }
    }

    fn step_through<const N: usize, const SPRING: bool, const DRAG: bool, const DAMPED: bool>(
        &mut self,
    ) -> Result<(), IntegrationError> {
        let problem = self.problem;
        let stage = &problem.stages[self.stage];
        let limit = problem.limit_of(self.stage);
        // Coefficients per unit mass, once a stage.
        let static_force = stage.static_force.over(problem.mass);
        let stiffness = stage.stiffness.over(problem.mass);
        let viscosity = stage.viscosity.over(problem.mass);
        let drag = stage.drag.over(problem.mass);
        let frequency = if SPRING { stiffness.value().sqrt() } else { 0.0 };
        // Only a driven stage with both springs and dashpots can creep towards its equilibrium for ever.
        let may_creep = SPRING && stage.static_force.value() < 0.0 && viscosity.value() >= 2.0 * frequency;

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

            let series = Series::<S, N>::new::<SPRING, DRAG, DAMPED>(&law, start.velocity);
            self.cost.steps += 1;
            self.cost.force_evaluations += if SPRING || DRAG { N as u64 - 1 } else { 1 };
            let span = if SPRING || DRAG { series.span(self.tolerance) } else { f64::INFINITY };
            let span = if SPRING { span.min(PHASE_MAX / (frequency * unit_time)) } else { span };
            let step = if SPRING && DRAG {
                search_certified(&law, &series, span, &self.closing)
            } else {
                search(&law, &series, start, span, &self.closing)
            };

            let (Step::Whole(local) | Step::Limit(local) | Step::Rest(local)) = step;
            let reached = depth + local.depth * S::from_f64(unit_depth);
            // The boundary's own depth, also where a rest just short of it rounds onto it.
            let at_limit = matches!(step, Step::Limit(_)) || reached.value() > limit.value();
            let next = State {
                time: time + local.time * S::from_f64(unit_time),
                depth: if at_limit { limit } else { reached },
                velocity: local.velocity * S::from_f64(unit_velocity),
            };
            if !(next.time.value().is_finite() && next.depth.value().is_finite() && next.velocity.value().is_finite()) {
                return Err(IntegrationError::NotFinite { what: "the state", last: self.state.values() });
            }
            self.widen_bar(&law, &start, &local, unit_velocity, next.depth.value() / unit_depth);
            self.state = next;
            match step {
                Step::Whole(_) => self.record(),
                Step::Limit(_) | Step::Rest(_) => return Ok(()),
            }
        }
        Err(IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, last: self.state.values() })
    }

    /// Adds the error of one step to the bar of `W/V0²`, in energy over depth, where it never grows:
    ///
    /// ```text
    /// d(dW)/dx = -(r/V + 2 q) dW/M,  so  dW -> dW e^-(r t/M + 2 q x/M)  over the step
    /// ```
    ///
    /// bounded by [`exit_energy::exp_from_below`], so that drag which takes 1e30 of W takes nearly as much of its error.
    ///
    /// A step adds `2 V dV` for V: three roundings of the greatest (the sum of the series cannot exceed a few times V,
    /// the time of the step is short of its radius) and one tolerance of truncation; and `2 F dx/M`, `F` the sum of the
    /// magnitudes of its terms, for the depth, which is rounded relative to its whole, and for the force, which is off
    /// by roundings of its terms over the way of the step. A force jump needs nothing more: both sides are integrated
    /// up to the exact boundary. Measured over random scenes, the error is at most half of the bar.
    #[inline(always)]
    fn widen_bar(&mut self, law: &Stage<S>, start: &State<S>, end: &State<S>, unit_velocity: f64, depth: f64) {
        let (v0, v1) = (start.velocity.value(), end.velocity.value());
        let fastest = v0.max(v1);
        let way = end.depth.value();
        let (r, q) = (law.viscosity.value(), law.drag.value());
        let force = law.static_force.value().abs() + law.stiffness.value() * way + (r + q * fastest) * fastest;
        let relative = unit_velocity / self.problem.impact_speed.value();
        let rounding = 6.0 * fastest * fastest + 3.0 * force * (depth + 2.0 * way);
        let added = S::EPSILON.max(f64::EPSILON) * rounding + 2.0 * self.tolerance * fastest * fastest;
        self.bar =
            self.bar / exit_energy::exp_from_below(r * end.time.value() + 2.0 * q * way) + relative * relative * added;
    }

    #[inline(always)]
    fn finish(self, through: bool) -> Flight<S> {
        let problem = self.problem;
        let (margin, bar) = if !problem.has_exit() {
            (None, None)
        } else if through {
            let least = self.least_at_ends.min(self.energy());
            (Some(least.value), Some(least.bar))
        } else {
            let scale = problem.impact_speed.value();
            let beyond = exit_energy::energy_beyond_stop(problem, self.stage, self.state.depth.value());
            let margin = beyond / scale / scale;
            // What a stop lacks is carried on in f64, with a few roundings of its own.
            (Some(margin), Some(self.bar + 8.0 * f64::EPSILON * margin.abs()))
        };
        // A margin that is no number decides nothing.
        let undecided =
            matches!((margin, bar), (Some(m), Some(b)) if m.abs().partial_cmp(&b) != Some(Ordering::Greater));
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
    ///
    /// Where the bar leaves open whether it gets out, it counts as there without speed, and that is returned.
    #[cold]
    fn is_lost_in_approach(&mut self, law: &Stage<S>) -> Result<bool, IntegrationError> {
        let never = |why| Err(IntegrationError::NeverEnds { why, last: self.state.values() });
        if law.stiffness.value() > 0.0 {
            // A spring stops everything but a creep, which is judged while it goes on.
            return Ok(false);
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
        let (law, limit, here) = (law.values(), self.problem.limit_of(self.stage), self.state.values());
        let mass = self.problem.mass.value();
        // dV/dx = -(r + q V)/M: V vanishes at the depth (M/q) ln(1 + q V/r), which is only approached.
        let Some(missing) = exit_energy::speed_missing(&law, mass, here, limit.value()) else { return Ok(false) };
        // The bar of V² is one of 2 V dV; and the place itself is rounded.
        let v0 = self.problem.impact_speed.value();
        if 2.0 * here.velocity * missing > self.bar * v0 * v0 + 4.0 * f64::EPSILON * here.velocity * here.velocity {
            return never("a resistance that vanishes with the velocity brings it to nothing before the boundary");
        }
        let time = S::from_f64(-f64::EPSILON.ln() * mass / law.viscosity);
        self.state = State { time: self.state.time + time, depth: limit, velocity: S::zero() };
        Ok(true)
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
    closing: &Closing,
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
    span: f64,
    closing: &Closing,
) -> Step<S> {
    let at = |time| series.at(time);
    let way = law.end.value();
    if let Some(root) = locate::first_root(&series.velocity_values(), span) {
        // The root is isolated; correct it in the number type, from the nearest trial.
        let rest = match locate::rest(law, at, at(root), span, closing) {
            Found::Inside(rest) => rest,
            _ => State { velocity: S::zero(), ..at(root) },
        };
        if rest.depth.value() >= way {
            return through(locate::passage(law, at, rest, rest.time.value(), true, closing));
        }
        return Step::Rest(rest);
    }
    let end = at(span);
    if end.depth.value() >= way {
        return through(locate::passage(law, at, end, span, true, closing));
    }
    Step::Whole(end)
}

/// A passage that is known to lie inside the step.
#[inline(always)]
fn through<S: Scalar>(found: Found<S>) -> Step<S> {
    match found {
        Found::Inside(state) | Found::Beyond(state) => Step::Limit(state),
        // `passage` gives up only where it does not know that the boundary is reached.
        Found::RestFirst => Step::Limit(State { time: S::zero(), depth: S::zero(), velocity: S::zero() }),
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test may stop at the first surprise")]
mod tests {
    use num_dual::Dual64;
    use proptest::prelude::Rng;
    use proptest::test_runner::{RngAlgorithm, TestRng};
    use twofloat::TwoFloat;

    use super::super::energy::Energy;
    use super::*;
    use crate::physics::{Stages, Target};

    /// Crater and tunnel with the continuous crater constant (theory section 1), and its closed form (section 2).
    #[derive(Clone, Copy, Debug)]
    struct Concrete {
        mass: f64,
        static_force: f64,
        drag: f64,
        crater_depth: f64,
        impact_speed: f64,
        exit_depth: f64,
    }

    impl Concrete {
        fn problem(self) -> Problem {
            let Self { mass, static_force, drag, crater_depth, impact_speed, exit_depth } = self;
            let stiffness = mass * (static_force + drag * impact_speed * impact_speed)
                / (crater_depth * (mass + crater_depth * drag));
            Problem {
                mass,
                impact_speed,
                exit_depth,
                stages: [Stage::crater(stiffness, crater_depth), Stage::tunnel(static_force, drag)]
                    .into_iter()
                    .collect(),
                crater: Some(0),
                target: Target::CraterAndTunnel,
            }
        }

        /// Velocity V with X(V) = exit depth, for an exit beyond the crater.
        fn critical_velocity(self) -> f64 {
            let Self { mass, static_force, drag, crater_depth, exit_depth, .. } = self;
            let way = exit_depth - crater_depth;
            let z = 2.0 * drag * way / mass;
            let v1_squared = 2.0 * static_force * way / mass * if z == 0.0 { 1.0 } else { z.exp_m1() / z };
            ((v1_squared * (mass + crater_depth * drag) + crater_depth * static_force) / mass).sqrt()
        }

        /// `d margin / d ln V0` at the critical velocity `V_c`; `margin = M/(M + k d Q) e^(-y) (1 - V_c²/V0²)`.
        fn margin_slope(self) -> f64 {
            let y = 2.0 * self.drag * (self.exit_depth - self.crater_depth) / self.mass;
            2.0 * (-y).exp() * self.mass / (self.mass + self.crater_depth * self.drag)
        }

        /// Depth and time of rest in a semi-infinite target.
        fn rest(self) -> (f64, f64) {
            let Self { mass: m, static_force: p, drag: q, crater_depth: kd, impact_speed: v0, .. } = self;
            let w = ((p + q * v0 * v0) / (kd * (m + kd * q))).sqrt();
            let v1_squared = (m * v0 * v0 - kd * p) / (m + kd * q);
            if v1_squared <= 0.0 {
                return (v0 / w, std::f64::consts::FRAC_PI_2 / w);
            }
            let v1 = v1_squared.sqrt();
            let u = q * v1_squared / p;
            let log_over = if u == 0.0 { 1.0 } else { u.ln_1p() / u };
            let a = v1 * (q / p).sqrt();
            let atan_over = if a == 0.0 { 1.0 } else { a.atan() / a };
            (kd + m * v1_squared / (2.0 * p) * log_over, (w * kd).atan2(v1) / w + m / p * v1 * atan_over)
        }
    }

    /// Uniform and log-uniform numbers from a fixed seed.
    struct Draw(TestRng);

    impl Draw {
        fn new(seed: u8) -> Self {
            Self(TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
        }
        fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * ((self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
        }
        fn log_between(&mut self, low: f64, high: f64) -> f64 {
            self.between(low.ln(), high.ln()).exp()
        }
        fn chance(&mut self, probability: f64) -> bool {
            self.between(0.0, 1.0) < probability
        }

        /// Groups over the whole admitted range: I 1e-9..1e6, N 1e-3..1e12 or no drag, H/d 1e-3..1e3.
        fn concrete(&mut self) -> Concrete {
            let (i, n, h) = (self.log_between(1e-9, 1e6), self.log_between(1e-3, 1e12), self.log_between(1e-3, 1e3));
            let (d, mass, strength) =
                (self.log_between(1e-3, 1.0), self.log_between(1e-3, 1e3), self.log_between(1e6, 1e9));
            let area = std::f64::consts::FRAC_PI_4 * d * d;
            Concrete {
                mass,
                static_force: area * strength,
                drag: if self.chance(0.1) { 0.0 } else { mass / (n * d * d * d) * area },
                crater_depth: d * self.between(0.3, 3.0),
                impact_speed: (i * strength * d * d * d / mass).sqrt(),
                exit_depth: h * d,
            }
        }

        /// One to four stages with any of the four terms, driven ones among them.
        fn stages(&mut self) -> Problem {
            let count = 1 + (self.0.next_u64() % 4) as usize;
            let mut stages = Stages::new();
            let mut end = 0.0;
            for index in 0..count {
                end += if self.chance(0.1) { 0.0 } else { self.between(0.01, 0.5) };
                let driven = self.chance(0.2);
                stages.push(Stage {
                    static_force: self.log_between(1.0, 1e3) * if driven { -1.0 } else { 1.0 },
                    stiffness: if self.chance(0.5) { self.log_between(1.0, 1e4) } else { 0.0 },
                    viscosity: if self.chance(0.5) { self.log_between(0.1, 300.0) } else { 0.0 },
                    drag: if self.chance(0.5) { self.log_between(0.01, 30.0) } else { 0.0 },
                    end: if index + 1 == count { f64::INFINITY } else { end },
                });
            }
            Problem {
                mass: 1.0,
                impact_speed: self.log_between(0.1, 100.0),
                exit_depth: if self.chance(0.5) { f64::INFINITY } else { self.between(0.02, 2.5) },
                stages,
                crater: None,
                target: Target::Stages,
            }
        }
    }

    /// The scenes of the peer benchmark: strength 36e6 Pa, S 12, k 2, density 2300, nose factor 0.72, d 50 mm, M 2 kg.
    fn peer_scene(impact_speed: f64, exit_depth: f64) -> Concrete {
        let d: f64 = 0.05;
        let area = std::f64::consts::FRAC_PI_4 * d * d;
        Concrete {
            mass: 2.0,
            static_force: area * 36.0e6 * 12.0,
            drag: area * 0.72 * 2300.0,
            crater_depth: 0.1,
            impact_speed,
            exit_depth,
        }
    }

    fn fly(problem: &Problem) -> Flight {
        Taylor::default().fly(problem, Detail::Events).unwrap()
    }

    fn relative(value: f64, exact: f64) -> f64 {
        if value == exact { 0.0 } else { ((value - exact) / exact).abs() }
    }

    fn kinds(flight: &Flight) -> Vec<EventKind> {
        flight.events.iter().map(|e| e.kind).collect()
    }

    fn one_stage(stage: Stage, impact_speed: f64, exit_depth: f64) -> Problem {
        Problem {
            mass: 1.0,
            impact_speed,
            exit_depth,
            stages: [stage].into_iter().collect(),
            crater: None,
            target: Target::Stages,
        }
    }

    #[test]
    fn tunnel_scene_agrees_with_fifty_digits() {
        // References: closed form at 50 digits from these f64 inputs.
        let flight = fly(&peer_scene(300.0, f64::INFINITY).problem());
        assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
        let crater_end = flight.crater_end().unwrap();
        assert!(relative(flight.end.depth, 0.144_826_200_112_217_08) < 1e-15);
        assert!(relative(flight.end.time, 8.291_966_948_249_334e-4) < 1e-15);
        assert!(relative(crater_end.time, 3.749_918_414_549_262e-4) < 1e-15);
        assert!(relative(crater_end.velocity, 202.320_580_497_900_37) < 1e-15);
        assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Rest]);
    }

    #[test]
    fn rest_agrees_with_the_closed_form_over_the_whole_range_of_groups() {
        let mut draw = Draw::new(1);
        for _ in 0..3000 {
            let scene = Concrete { exit_depth: f64::INFINITY, ..draw.concrete() };
            let flight = fly(&scene.problem());
            let (depth, time) = scene.rest();
            // The closed form itself is good to a few units in the last place.
            assert!(relative(flight.end.depth, depth) < 5e-15, "{scene:?} {flight:?}");
            assert!(relative(flight.end.time, time) < 1e-13, "{scene:?} {flight:?}");
            assert!(flight.cost.steps <= 120, "{scene:?} {:?}", flight.cost);
        }
    }

    #[test]
    fn f64_agrees_with_double_double_on_random_stages_of_every_kind() {
        let mut draw = Draw::new(2);
        let mut finished = 0;
        for _ in 0..400 {
            let problem = draw.stages();
            let flight = Taylor::default().fly(&problem, Detail::Events);
            let reference = Taylor::default().fly_in::<TwoFloat>(&problem.cast(), Detail::Events);
            let (flight, reference) = match (flight, reference) {
                (Ok(flight), Ok(reference)) => (flight, reference.values()),
                (Err(a), Err(b)) => {
                    assert_eq!(std::mem::discriminant(&a), std::mem::discriminant(&b), "{problem:?}");
                    continue;
                }
                (a, b) => panic!("{problem:?}\n{a:?}\n{b:?}"),
            };
            finished += 1;
            assert_eq!(flight.outcome, reference.outcome, "{problem:?}");
            assert_eq!(kinds(&flight), kinds(&reference), "{problem:?}");
            let fastest = reference.events.iter().map(|e| e.state.velocity).fold(problem.impact_speed, f64::max);
            for (event, exact) in flight.events.iter().zip(&reference.events) {
                // Inherent: a boundary passed slowly, before or here, scatters the time after it.
                let condition = reference
                    .events
                    .iter()
                    .filter(|e| e.kind != EventKind::Rest)
                    .map(|e| fastest / e.state.velocity)
                    .fold(1.0, f64::max);
                assert!(relative(event.state.depth, exact.state.depth) < 5e-15 * condition, "{event:?} {problem:?}");
                assert!(relative(event.state.time, exact.state.time) < 2e-14 * condition, "{event:?} {problem:?}");
                let off = (event.state.velocity - exact.state.velocity).abs() / fastest;
                assert!(off < 2e-14 * condition, "{event:?} {exact:?} {problem:?}");
            }
        }
        assert!(finished > 250, "only {finished} flights ended");
    }

    #[test]
    fn general_stages_agree_with_their_closed_forms() {
        let drive = |p, s, r, q| Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end: f64::INFINITY };
        // p, r: T = (M/r) log1p(z), X = (M V0²/p)(z - log1p(z))/z², z = r V0/p.
        let (p, r, v) = (7.0, 3.0, 5.0);
        let z: f64 = r * v / p;
        let flight = fly(&one_stage(drive(p, 0.0, r, 0.0), v, f64::INFINITY));
        assert!(relative(flight.end.time, z.ln_1p() / r) < 1e-15);
        assert!(relative(flight.end.depth, v * v / p * (z - z.ln_1p()) / (z * z)) < 2e-15);
        // p, s: X = (V0/w)²/(u0 + hypot(u0, V0/w)), T = atan2(V0, w u0)/w; driven and resisting.
        for p in [7.0, -7.0_f64] {
            let s: f64 = 11.0;
            let (w, u) = (s.sqrt(), p / s);
            let flight = fly(&one_stage(drive(p, s, 0.0, 0.0), v, f64::INFINITY));
            assert!(relative(flight.end.depth, (v / w) * (v / w) / (u + u.hypot(v / w))) < 1e-15);
            assert!(relative(flight.end.time, v.atan2(w * u) / w) < 1e-15);
        }
        // r alone with an exit: V = V0 - r H/M.
        let flight = fly(&one_stage(drive(0.0, 0.0, 2.0, 0.0), 10.0, 4.0));
        assert_eq!(flight.outcome, Outcome::Perforated);
        assert!(relative(flight.end.velocity, 2.0) < 1e-14 && relative(flight.end.time, 5.0_f64.ln() / 2.0) < 1e-14);
        // q alone with an exit: V = V0 exp(-q H/M).
        let flight = fly(&one_stage(drive(0.0, 0.0, 0.0, 2.0), 10.0, 4.0));
        assert!(relative(flight.end.velocity, 10.0 * (-8.0_f64).exp()) < 1e-14);
        assert!(relative(flight.end.time, 8.0_f64.exp_m1() / 20.0) < 1e-14);
        // No force at all: V0 t = H.
        let flight = fly(&one_stage(drive(0.0, 0.0, 0.0, 0.0), 10.0, 4.0));
        assert_eq!((flight.end.velocity, flight.end.time), (10.0, 0.4));
    }

    #[test]
    fn graze_ladder_is_right_outside_the_bar_and_undecided_only_inside() {
        let mut draw = Draw::new(3);
        let (mut undecided, mut flights) = (0, 0);
        for _ in 0..300 {
            let mut scene = draw.concrete();
            scene.exit_depth = scene.crater_depth + scene.exit_depth.min(1e2 * scene.crater_depth);
            let critical = scene.critical_velocity();
            let slope = scene.margin_slope();
            if slope < 1e-10 || !critical.is_finite() {
                continue;
            }
            for j in 1..=15 {
                for sign in [1.0, -1.0] {
                    scene.impact_speed = critical * (1.0 + sign * 10.0_f64.powi(-j));
                    let off = scene.impact_speed / critical - 1.0;
                    let flight = fly(&scene.problem());
                    let bar = flight.exit_margin_error.unwrap();
                    let margin = flight.exit_margin.unwrap();
                    flights += 1;
                    assert!(bar < 3e-14, "bar {bar:e} of {scene:?}");
                    let exact = 0.5 * slope * off * (2.0 + off) / ((1.0 + off) * (1.0 + off));
                    // 4e-15: the closed form of V_c, and the crater constant, rounded.
                    let error = (margin - exact).abs();
                    assert!(error <= bar + 4e-15 * slope, "{margin:e} {exact:e} {bar:e} {slope} {scene:?}");
                    match flight.outcome {
                        Outcome::Perforated => assert!(margin > bar && off > -2e-15, "{off:e} {scene:?}"),
                        Outcome::Undecided => {
                            undecided += 1;
                            assert!((slope * off).abs() < 2.0 * bar + 4e-15, "{off:e} {bar:e} {scene:?}");
                        }
                        _ => assert!(margin < -bar && off < 2e-15, "{off:e} {scene:?}"),
                    }
                }
            }
        }
        assert!(undecided > 0 && undecided < flights / 5, "{undecided} of {flights} undecided");
    }

    #[test]
    fn a_scan_of_a_thousand_speeds_around_the_critical_flips_once() {
        for width in [1e-1, 1e-6, 1e-11, 1e-13] {
            let mut scene = peer_scene(0.0, 0.18);
            let critical = scene.critical_velocity();
            let mut last = -1;
            for i in 0..1000 {
                scene.impact_speed = critical * (1.0 + width * (f64::from(i) / 500.0 - 1.0));
                let now = match fly(&scene.problem()).outcome {
                    Outcome::Perforated => 1,
                    Outcome::Undecided => 0,
                    _ => -1,
                };
                assert!(now >= last, "outcome fell from {last} to {now} at {}", scene.impact_speed);
                last = now;
            }
            assert_eq!(last, if width > 1e-12 { 1 } else { last });
        }
    }

    #[test]
    fn margin_bar_covers_the_error_of_perforations() {
        let mut draw = Draw::new(4);
        let mut worst: f64 = 0.0;
        for _ in 0..600 {
            let problem = draw.concrete().problem();
            let flight = fly(&problem);
            let reference = Taylor::default().fly_in::<TwoFloat>(&problem.cast(), Detail::End).unwrap();
            if flight.outcome != Outcome::Perforated {
                continue;
            }
            let relative = reference.end.velocity / TwoFloat::from(problem.impact_speed);
            let exact = (relative * relative).hi();
            worst = worst.max((flight.exit_margin.unwrap() - exact).abs() / flight.exit_margin_error.unwrap());
        }
        assert!(worst > 0.02 && worst < 0.6, "worst error is {worst} of its bar");
    }

    #[test]
    fn simultaneous_crater_end_exit_and_rest_give_one_verdict_and_ordered_events() {
        // Q = 0 and V0 = sqrt(k d P/M): rest at x = k d = H. Powers of two, so nothing is rounded but the series.
        for off in [0.0, 1e-12, -1e-12, 1e-6, -1e-6] {
            let scene = Concrete {
                mass: 2.0,
                static_force: 1024.0,
                drag: 0.0,
                crater_depth: 0.125,
                impact_speed: 8.0 * (1.0 + off),
                exit_depth: 0.125,
            };
            let flight = fly(&scene.problem());
            assert!(relative(flight.end.depth, 0.125_f64.min(0.125 * (1.0 + off))) < 5e-15, "{flight:?}");
            match flight.outcome {
                Outcome::Undecided => assert!(off == 0.0),
                Outcome::Perforated => {
                    assert!(off > 0.0);
                    assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Exit]);
                }
                _ => {
                    assert!(off < 0.0);
                    assert_eq!(kinds(&flight), [EventKind::Rest]);
                }
            }
            assert!(flight.cost.steps <= 2);
        }
        // Constant force touches the boundary without rounding: V0 = 4, F/M = 8, X = 1.
        let mut problem = one_stage(Stage::tunnel(8.0, 0.0), 4.0, 1.0);
        problem.stages.insert(0, Stage { end: 1.0, ..Stage::tunnel(8.0, 0.0) });
        let flight = fly(&problem);
        assert_eq!(kinds(&flight), [EventKind::StageEnd(0), EventKind::Exit, EventKind::Rest]);
        assert_eq!((flight.outcome, flight.stage, flight.exit_margin), (Outcome::Undecided, 0, Some(0.0)));
        assert_eq!(flight.end, State { time: 0.5, depth: 1.0, velocity: 0.0 });
    }

    #[test]
    fn a_target_thinner_than_the_crater_has_no_crater_end() {
        let ulp = f64::EPSILON * 0.1;
        for (exit, crater_end) in [(0.05, false), (0.1 - ulp, false), (0.1, true), (0.1 + ulp, true), (1e-9, false)] {
            let flight = fly(&peer_scene(300.0, exit).problem());
            assert_eq!(flight.outcome, Outcome::Perforated, "H = {exit}");
            assert_eq!(flight.crater_end().is_some(), crater_end, "H = {exit}");
            assert_eq!(flight.end.depth, exit);
        }
        let flight = fly(&peer_scene(300.0, 0.0).problem());
        assert_eq!((flight.outcome, flight.end.velocity), (Outcome::Perforated, 300.0));
    }

    #[test]
    fn many_ends_inside_one_step_are_all_passed_in_order_and_change_nothing() {
        let whole = peer_scene(300.0, 0.14).problem();
        let mut split = whole.clone();
        split.target = Target::Stages;
        split.crater = None;
        split.stages.clear();
        // Ten ends in the crater, three of them equal and two one spacing apart, and more in the tunnel.
        let (crater, tunnel) = (whole.stages[0], whole.stages[1]);
        for end in [0.01, 0.02, 0.02, 0.02, 0.03, 0.03_f64.next_up(), 0.05, 0.07, 0.0999, 0.1] {
            split.stages.push(Stage { end, ..crater });
        }
        for end in [0.1, 0.1_f64.next_up(), 0.12, 0.14, 0.15] {
            split.stages.push(Stage { end, ..tunnel });
        }
        split.stages.push(tunnel);
        let (whole, flight) = (fly(&whole), fly(&split));
        let mut expected: Vec<EventKind> = (0..14).map(EventKind::StageEnd).collect();
        expected.push(EventKind::Exit);
        assert_eq!(kinds(&flight), expected);
        assert!(flight.events.windows(2).all(|e| e[0].state.time <= e[1].state.time));
        assert!(relative(flight.end.time, whole.end.time) < 2e-15);
        assert!(relative(flight.end.velocity, whole.end.velocity) < 2e-14);
        assert_eq!(flight.stage, 13);
    }

    #[test]
    fn a_boundary_on_the_end_of_a_step_is_passed_once() {
        let scene = peer_scene(900.0, f64::INFINITY);
        let flight = Taylor::default().fly(&scene.problem(), Detail::Trajectory).unwrap();
        // Samples: impact, crater end, steps of the tunnel, rest.
        let inside = flight.trajectory.len() - 2;
        assert!(inside > 3, "{:?}", flight.trajectory);
        let depth = flight.trajectory[inside].state.depth;
        for end in [depth.next_down(), depth, depth.next_up()] {
            let mut problem = scene.problem();
            problem.stages.insert(1, Stage { end, ..problem.stages[1] });
            let again = Taylor::default().fly(&problem, Detail::Trajectory).unwrap();
            assert_eq!(kinds(&again), [EventKind::CraterEnd, EventKind::StageEnd(1), EventKind::Rest]);
            assert!(relative(again.end.depth, flight.end.depth) < 2e-15);
            assert!(again.trajectory.windows(2).all(|s| s[0].state.time <= s[1].state.time));
        }
    }

    #[test]
    fn rest_near_the_crater_end_is_continuous_and_cheap() {
        // V1² = 0 at V0 = sqrt(k d P/M), approached from both sides down to one spacing.
        let mut scene = peer_scene(0.0, f64::INFINITY);
        let touching = (scene.crater_depth * scene.static_force / scene.mass).sqrt();
        for j in 1..=17 {
            for sign in [1.0, -1.0] {
                scene.impact_speed = touching * (1.0 + sign * 10.0_f64.powi(-j));
                let flight = fly(&scene.problem());
                let (depth, time) = scene.rest();
                assert!(relative(flight.end.depth, depth) < 5e-15, "1e-{j}: {flight:?}");
                assert!(
                    relative(flight.end.time, time) < 1e-14,
                    "1e-{j}: {} {time} {:e}",
                    flight.end.time,
                    relative(flight.end.time, time)
                );
                assert!(flight.cost.steps <= 4, "{:?}", flight.cost);
                if j < 14 {
                    assert_eq!(flight.outcome == Outcome::StoppedInTunnel, sign > 0.0);
                }
            }
        }
    }

    #[test]
    fn a_flight_without_an_end_says_so() {
        let law = |p, s, r, q| Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end: f64::INFINITY };
        let endless = [
            (law(0.0, 0.0, 0.0, 0.0), f64::INFINITY),
            (law(0.0, 0.0, 2.0, 0.0), f64::INFINITY),
            (law(0.0, 0.0, 0.0, 2.0), f64::INFINITY),
            (law(-1.0, 0.0, 3.0, 1.0), f64::INFINITY),
            // r alone covers M V0/r = 5 m and no more; with drag ln(1 + q V0/r)/q. Nearer is undecided.
            (law(0.0, 0.0, 2.0, 0.0), 5.0 + 1e-13),
            (law(0.0, 0.0, 2.0, 1.0), 6.0_f64.ln() + 1e-13),
            // Overdamped towards x = 10.
            (law(-1000.0, 100.0, 1000.0, 0.0), f64::INFINITY),
            (law(-1000.0, 100.0, 1000.0, 5.0), 10.0),
        ];
        for (stage, exit) in endless {
            let error = Taylor::default().fly(&one_stage(stage, 10.0, exit), Detail::Events).unwrap_err();
            assert!(matches!(error, IntegrationError::NeverEnds { .. }), "{stage:?}: {error}");
            assert!(error.last().is_some());
        }
        // Just this side of each limit the flight ends.
        for (stage, exit) in
            [(law(0.0, 0.0, 2.0, 0.0), 4.999), (law(0.0, 0.0, 2.0, 1.0), 1.79), (law(-1.0, 0.0, 3.0, 1.0), 50.0)]
        {
            assert_eq!(fly(&one_stage(stage, 10.0, exit)).outcome, Outcome::Perforated, "{stage:?}");
        }
    }

    #[test]
    fn the_stiff_driven_scene_is_flown_and_its_cost_shows_why_not_to() {
        // Theory section 1: leaves at H = 9 m after about (r/s) ln(1/(1 - s H/|p|)) = 23 s.
        let law = Stage { static_force: -1000.0, stiffness: 100.0, viscosity: 1000.0, drag: 0.0, end: f64::INFINITY };
        let flight = fly(&one_stage(law, 1.0, 9.0));
        assert_eq!(flight.outcome, Outcome::Perforated);
        // Slow rate l2 = r/2 - sqrt(r²/4 - s), and x = 10 - A exp(-l2 t) - B exp(-l1 t).
        let root = (500.0_f64 * 500.0 - 100.0).sqrt();
        let (fast, slow) = (500.0 + root, 100.0 / (500.0 + root));
        let amplitude = (10.0 * fast - 1.0) / (fast - slow);
        let time = amplitude.ln() / slow;
        assert!(relative(flight.end.time, time) < 1e-12, "{} {time}", flight.end.time);
        assert!((1000..20_000).contains(&flight.cost.steps), "{:?}", flight.cost);
    }

    #[test]
    fn no_step_spans_more_than_the_phase_in_which_the_sign_of_v_is_decisive() {
        // Driven from far below its balance, a spring takes nearly half a period to rest; the loosest tolerance takes
        // the longest steps.
        let law = Stage { static_force: -100.0, stiffness: 1.0, viscosity: 0.0, drag: 0.0, end: f64::INFINITY };
        for rtol in [0.1, 1e-3, 0.0] {
            let taylor = Taylor::with_rtol(rtol).unwrap();
            let flight = taylor.fly(&one_stage(law, 0.1, f64::INFINITY), Detail::Trajectory).unwrap();
            let longest = flight.trajectory.windows(2).map(|s| s[1].state.time - s[0].state.time).fold(0.0, f64::max);
            assert!(longest <= PHASE_MAX && flight.cost.steps >= 2, "{longest} at rtol {rtol}");
            assert!(relative(flight.end.time, 0.1_f64.atan2(-100.0)) < rtol.max(1e-14), "{:?}", flight.end);
        }
    }

    #[test]
    fn a_barrier_before_a_drive_decides_the_margin() {
        // F = +8 for 1 m, then -100: W is least at the barrier's end, 16.02 - 16 = 0.02 (V0² = 16.02).
        let mut problem = one_stage(Stage::tunnel(-100.0, 0.0), 16.02_f64.sqrt(), 3.0);
        problem.stages.insert(0, Stage { end: 1.0, ..Stage::tunnel(8.0, 0.0) });
        let flight = fly(&problem);
        assert_eq!(flight.outcome, Outcome::Perforated);
        assert!((flight.exit_margin.unwrap() - 0.02 / 16.02).abs() < 1e-14);
        problem.impact_speed = 4.0;
        assert_eq!(fly(&problem).outcome, Outcome::Undecided);
    }

    #[test]
    fn only_stages_entered_cost_anything() {
        let flight = fly(&peer_scene(60.0, f64::INFINITY).problem());
        assert_eq!(flight.outcome, Outcome::StoppedInCrater);
        assert_eq!(flight.cost, Cost { steps: 1, rejected_steps: 0, force_evaluations: 23 });
        assert!(flight.trajectory.is_empty() && flight.notes.is_empty());
        let lines = Taylor::explain(&peer_scene(60.0, f64::INFINITY).problem(), &flight);
        assert_eq!(lines, ["stage 0: a spring alone: recurrence of one term, no convolution"]);
        // The end alone is the same end.
        let end = Taylor::default().fly(&peer_scene(60.0, 1.0).problem(), Detail::End).unwrap();
        assert!(end.events.is_empty());
        assert_eq!(end.end, flight.end);
    }

    #[test]
    fn a_looser_tolerance_is_kept_at_less_work() {
        let mut draw = Draw::new(5);
        let mut work = Vec::new();
        for rtol in [1e-3, 1e-6, 1e-9, 1e-12, 0.0] {
            let taylor = Taylor::with_rtol(rtol).unwrap();
            let mut evaluations = 0;
            for _ in 0..200 {
                let scene = Concrete { exit_depth: f64::INFINITY, ..draw.concrete() };
                let flight = taylor.fly(&scene.problem(), Detail::Events).unwrap();
                let (depth, time) = scene.rest();
                assert!(relative(flight.end.depth, depth) < rtol.max(5e-15), "{rtol:e} {scene:?} {flight:?}");
                assert!(relative(flight.end.time, time) < rtol.max(1e-13), "{rtol:e} {scene:?} {flight:?}");
                evaluations += flight.cost.force_evaluations;
            }
            work.push(evaluations);
        }
        assert!(work.windows(2).all(|w| w[0] < w[1]), "{work:?}");
        for bad in [-1e-3, 0.2, f64::NAN] {
            assert!(Taylor::with_rtol(bad).is_err_and(|e| e.is_usage()));
        }
    }

    #[test]
    fn the_same_code_runs_in_single_precision_and_in_dual_numbers() {
        let scene = peer_scene(300.0, f64::INFINITY);
        let single = Taylor::default().fly_in::<f32>(&scene.problem().cast(), Detail::Events).unwrap();
        assert!(relative(single.end.depth.value(), 0.144_826_200_112_217_08) < 5e-7);
        assert_eq!(single.outcome, Outcome::StoppedInTunnel);

        // d/dV0 of the tunnel alone: X = (M/2Q) ln(1 + Q V0²/P), dX/dV0 = M V0/(P + Q V0²), dT/dV0 = M/(P + Q V0²).
        let Concrete { mass, static_force, drag, .. } = scene;
        let mut problem: Problem<Dual64> = Problem {
            mass,
            impact_speed: 300.0,
            exit_depth: f64::INFINITY,
            stages: [Stage::tunnel(static_force, drag)].into_iter().collect(),
            crater: None,
            target: Target::CraterAndTunnel,
        }
        .cast();
        problem.impact_speed = Dual64::new(300.0, 1.0);
        let flight = Taylor::default().fly_in(&problem, Detail::Events).unwrap();
        let force = static_force + drag * 300.0 * 300.0;
        assert!(relative(flight.end.depth.eps, mass * 300.0 / force) < 1e-14);
        assert!(relative(flight.end.time.eps, mass / force) < 1e-14);

        // And through an exit: dV_r/dV0 = (V0/V_r) exp(-2 Q H/M).
        problem.exit_depth = Dual64::from_re(0.05);
        let flight = Taylor::default().fly_in(&problem, Detail::Events).unwrap();
        let slope = 300.0 / flight.end.velocity.re * (-2.0 * drag * 0.05 / mass).exp();
        assert!(relative(flight.end.velocity.eps, slope) < 1e-14, "{} {slope}", flight.end.velocity.eps);
        assert_eq!(flight.end.depth.eps, 0.0);
    }

    #[test]
    fn forces_beyond_all_numbers_are_an_error_and_extreme_units_are_not() {
        let error = Taylor::default().fly(&one_stage(Stage::tunnel(1e308, 1e308), 1e200, 1.0), Detail::Events);
        assert!(matches!(error, Err(IntegrationError::NotFinite { .. })), "{error:?}");
        // Scaling length by a, time by b and mass by c changes no outcome and scales depth and time.
        let base = fly(&peer_scene(300.0, f64::INFINITY).problem());
        for (a, b, c) in [(1e-12, 1e6, 1e-9), (1e9, 1e-12, 1e12), (1e-30, 1e-30, 1e-30)] {
            let scene = peer_scene(300.0, f64::INFINITY);
            let flight = fly(&Concrete {
                mass: scene.mass * c,
                static_force: scene.static_force * c * a / (b * b),
                drag: scene.drag * c / a,
                crater_depth: scene.crater_depth * a,
                impact_speed: scene.impact_speed * a / b,
                exit_depth: f64::INFINITY,
            }
            .problem());
            assert!(relative(flight.end.depth, base.end.depth * a) < 2e-15);
            assert!(relative(flight.end.time, base.end.time * b) < 2e-15);
        }
    }

    /// Mass 2, one stage: a problem for the parts of a course that are asked directly.
    fn alone(stage: Stage, exit_depth: f64) -> Problem {
        let stages = Stages::from_slice(&[stage]);
        Problem { mass: 2.0, impact_speed: 300.0, exit_depth, stages, crater: None, target: Target::Stages }
    }

    fn course_at(problem: &Problem, depth: f64, velocity: f64) -> Course<'_, f64, 22, 24> {
        let mut course = Course::new(problem, f64::EPSILON, Detail::End);
        course.state = State { time: 0.0, depth, velocity };
        course
    }

    /// `V' = -V²` from V = 1 is `1/(1 + t)`: coefficients 1, -1, 1, ... of V and of x over its order.
    #[test]
    fn coefficients_keep_the_digits_of_double_double() {
        let law = Stage::<f64>::tunnel(0.0, 1.0);
        let wide = Stage {
            static_force: TwoFloat::from(law.static_force),
            stiffness: TwoFloat::from(0.0),
            viscosity: TwoFloat::from(0.0),
            drag: TwoFloat::from(law.drag),
            end: TwoFloat::from(1.0),
        };
        let series = Series::<TwoFloat, 40>::new::<false, true, true>(&wide, TwoFloat::from(1.0));
        for k in 0..40 {
            let sign = TwoFloat::from(if k % 2 == 0 { 1.0 } else { -1.0 });
            let way = series.advance[k] * TwoFloat::from((k + 1) as f64);
            for off in [series.velocity[k] - sign, way - sign] {
                assert!(off.value().abs() < 1e-28, "order {k}: {:e}", off.value());
            }
        }
    }

    /// Every term of the bar with its own factor, in numbers that can be followed by hand.
    #[test]
    fn a_step_adds_its_roundings_to_a_bar_that_fades() {
        let problem = alone(Stage::tunnel(1.0, 0.0), f64::INFINITY);
        let mut course = course_at(&problem, 0.0, 300.0);
        course.bar = f64::EPSILON;
        let law = Stage { static_force: -1.1, stiffness: 0.7, viscosity: 0.3, drag: 0.9, end: 1.0 };
        let start = State { time: 0.0, depth: 0.0, velocity: 1.5 };
        let end = State { time: 0.4, depth: 0.6, velocity: 1.2 };
        course.widen_bar(&law, &start, &end, 30.0, 0.8);
        // Force 1.1 + 0.42 + 2.475; roundings 6 V² + 3 F (0.8 + 1.2), truncation 2 V²; a hundredth of it, for V/V0 = 0.1.
        let added = 0.01 * (6.0 * 2.25 + 3.0 * 3.995 * 2.0 + 2.0 * 2.25);
        let fading = (1.0_f64 + (0.3 * 0.4 + 2.0 * 0.9 * 0.6) / 8.0).powi(8);
        let expected = 1.0 / fading + added;
        assert!(
            (course.bar / f64::EPSILON / expected - 1.0).abs() < 1e-14,
            "{} for {expected}",
            course.bar / f64::EPSILON
        );
    }

    /// M = 2, r = 10, s = 8, p = -16: equilibrium 2 m, fast rate 2.5 + sqrt(6.25 - 4) = 4 /s.
    #[test]
    fn a_creep_begins_at_the_line_of_the_fast_rate_and_only_before_the_equilibrium() {
        let stage = Stage { static_force: -16.0, stiffness: 8.0, viscosity: 10.0, drag: 0.0, end: f64::INFINITY };
        let problem = alone(stage, f64::INFINITY);
        for (depth, velocity, limit, creeps) in [
            (0.5, 6.0, 2.0, true),
            (0.5, 6.0_f64.next_up(), 2.0, false),
            (0.5, 6.0, 2.0_f64.next_down(), false),
            (2.0, 0.0, f64::INFINITY, false),
        ] {
            let refused = course_at(&problem, depth, velocity).refuse_creep(&stage, limit);
            assert_eq!(refused.is_err(), creeps, "{depth}, {velocity}, {limit}");
        }
    }

    /// M V/r = 4 m are left to a viscosity alone, from x = 0.5 on.
    #[test]
    fn a_stage_without_static_force_is_refused_for_its_own_reason() {
        let stage = |p, r, q| Stage { viscosity: r, ..Stage::tunnel(p, q) };
        let lost = |stage: Stage, exit: f64| course_at(&alone(stage, exit), 0.5, 3.0).is_lost_in_approach(&stage);
        for (stage, why) in [
            (stage(-1.0, 0.0, 0.0), "drives"),
            (stage(-1.0, 1.5, 0.0), "drives"),
            (stage(0.0, 0.0, 0.0), "no resistance"),
            (stage(0.0, 1.5, 0.0), "vanishes with the velocity"),
            (stage(0.0, 0.0, 1.0), "vanishes with the velocity"),
        ] {
            let error = lost(stage, f64::INFINITY).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
        assert!(lost(stage(0.0, 1.5, 0.0), 4.5 + 1e-14).is_err());
        assert_eq!(lost(stage(0.0, 1.5, 0.0), 4.5_f64.next_down()), Ok(false));
        assert_eq!(lost(stage(-1.0, 1.5, 0.0), 4.5), Ok(false));
    }

    /// As above: at 4.5 m no speed is left, and what the bar holds decides whether more is missing.
    #[test]
    fn an_approach_that_the_bar_cannot_tell_from_arrival_is_undecided() {
        let problem = |exit| alone(Stage { viscosity: 1.5, ..Stage::tunnel(0.0, 0.0) }, exit);
        let undecided = |exit: f64, bar: f64| {
            let problem = problem(exit);
            let mut course = course_at(&problem, 0.5, 3.0);
            course.bar = bar;
            course.is_lost_in_approach(&problem.stages[0]).map(|lost| (lost, course.state.depth, course.state.velocity))
        };
        assert_eq!(undecided(4.5, 0.0), Ok((true, 4.5, 0.0)));
        // Nor what the rounding of the place does: a spacing is 4e-15 of V², and 4 eps V² are 8e-15.
        assert_eq!(undecided(4.5_f64.next_up(), 0.0), Ok((true, 4.5_f64.next_up(), 0.0)));
        // r dx/M = 0.75e-9 m/s are missing, and 2 V as much of V²: 4.5e-9 m²/s².
        let v0 = problem(4.5).impact_speed;
        assert_eq!(undecided(4.5 + 1e-9, 4.6e-9 / v0 / v0), Ok((true, 4.5 + 1e-9, 0.0)));
        assert!(undecided(4.5 + 1e-9, 4.4e-9 / v0 / v0).is_err());
        let flight = Taylor::default().fly(&Problem { impact_speed: 3.0, ..problem(4.0) }, Detail::Events).unwrap();
        assert_eq!((flight.outcome, flight.exit_margin), (Outcome::Undecided, Some(0.0)));
        // Until the speed is an epsilon of what it was: M/r ln(1/eps).
        assert!((flight.end.time / (2.0 / 1.5 * 36.043_653_389_117_15) - 1.0).abs() < 1e-14, "{}", flight.end);
    }

    /// Orders as tabled, in evaluations a step; a tolerance at the seam takes the higher.
    #[test]
    fn the_order_follows_from_the_tolerance() {
        let drag = one_stage(Stage::tunnel(1.0, 1.0), 10.0, f64::INFINITY);
        let spring = one_stage(Stage { stiffness: 1.0, ..Stage::tunnel(1.0, 0.0) }, 10.0, f64::INFINITY);
        let orders = |taylor: Taylor| {
            [&drag, &spring].map(|problem| {
                let cost = taylor.fly(problem, Detail::End).unwrap().cost;
                cost.force_evaluations as f64 / cost.steps as f64
            })
        };
        for (rtol, expected) in [
            (1e-3, [7.0, 9.0]),
            (5e-6, [11.0, 17.0]),
            (1e-7, [11.0, 17.0]),
            (5e-10, [15.0, 19.0]),
            (1e-11, [15.0, 19.0]),
            (5e-14, [21.0, 23.0]),
            (0.0, [21.0, 23.0]),
        ] {
            assert_eq!(orders(Taylor::with_rtol(rtol).unwrap()), expected, "{rtol:e}");
        }
        for (rtol, expected) in [(1e-17, 21), (5e-18, 39), (0.0, 39)] {
            let wide = Taylor::with_rtol(rtol).unwrap().fly_in::<TwoFloat>(&drag.cast(), Detail::End).unwrap();
            assert_eq!(wide.cost.force_evaluations, expected * wide.cost.steps, "{rtol:e}");
        }
    }

    #[test]
    fn every_kind_of_stage_is_explained() {
        let law = |s, r, q, end| Stage { static_force: 1.0, stiffness: s, viscosity: r, drag: q, end };
        let stages = [
            law(0.0, 0.0, 0.0, 0.1),
            law(1.0, 0.0, 0.0, 0.2),
            law(1.0, 1.0, 0.0, 0.3),
            law(0.0, 1.0, 1.0, 0.4),
            law(1.0, 0.0, 1.0, f64::INFINITY),
        ];
        let problem = Problem { stages: Stages::from_slice(&stages), ..one_stage(stages[0], 10.0, 0.5) };
        assert_eq!(
            Taylor::explain(&problem, &fly(&problem)),
            [
                "stage 0: constant force: the series ends, one step serves",
                "stage 1: a spring alone: recurrence of one term, no convolution",
                "stage 2: no drag: recurrence of two terms, no convolution",
                "stage 3: no stiffness: V monotone, no search for hidden roots",
                "stage 4: stiffness and drag: earliest root isolated on every step",
            ]
        );
        assert_eq!(Taylor::default().name(), "taylor");
    }

    #[test]
    fn a_flight_that_ends_at_impact_lists_its_events_only_where_asked() {
        let problem = peer_scene(300.0, 0.0).problem();
        assert_eq!(kinds(&fly(&problem)), [EventKind::Exit]);
        assert!(Taylor::default().fly(&problem, Detail::End).unwrap().events.is_empty());
    }

    /// `(tolerance v[0]/|v[k]|)^(1/k)` in full precision; logarithms off by 1 % of h, a power short by up to 6 %.
    #[test]
    fn a_span_keeps_the_tolerance_in_each_of_the_last_two_orders() {
        let span = |first, before, last, tolerance| {
            let velocity = [first, 0.0, 0.0, 0.0, 0.0, 0.0, before, last];
            Series { velocity, advance: [0.0; 8] }.span(tolerance)
        };
        for tolerance in [1e-3, 1e-9, 1e-16] {
            for first in [1.0, 1.3, 1.9] {
                for size in [1e-2, 1.0, 7e3_f64] {
                    let exact = |order: f64| (tolerance * first / size).powf(1.0 / order);
                    let last = span(first, 0.0, -size, tolerance) / exact(7.0);
                    let before = span(first, size, 0.0, tolerance) / exact(6.0);
                    for ratio in [last, before] {
                        assert!(ratio > 0.93 && ratio < 1.01, "{ratio}: {tolerance:e}, {first}, {size}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_unit_has_an_inverse_that_is_a_normal_number() {
        for x in [f64::MIN_POSITIVE, 0.75, 1.0, 1.5, f64::MAX, f64::INFINITY] {
            let unit = power_of_two_below(x);
            assert!(unit <= x && (1.0 / unit).is_normal(), "{unit:e} for {x:e}");
        }
    }

    #[test]
    fn the_lesser_margin_has_the_bar_of_the_greater_as_far_as_it_reaches_below() {
        let barred = |value, bar| Barred { value, bar };
        for (greater, bar) in [(barred(1.5, 0.75), 0.25), (barred(1.5, 0.125), 0.125), (barred(3.0, 0.5), 0.125)] {
            let lesser = barred(1.0, 0.125);
            for least in [lesser.min(greater), greater.min(lesser)] {
                assert_eq!((least.value, least.bar), (1.0, bar), "{}", greater.value);
            }
        }
    }

    /// Theory section 2, `p, s, r` with p < 0: it swings through the balance at 10 m, on to rest.
    #[test]
    fn an_underdamped_drive_is_no_creep() {
        let (p, s, r, v) = (-1000.0, 100.0, 15.0, 0.1_f64);
        let law = Stage { static_force: p, stiffness: s, viscosity: r, drag: 0.0, end: f64::INFINITY };
        let flight = fly(&one_stage(law, v, f64::INFINITY));
        let (g, w, u) = (0.5 * r, s.sqrt(), p / s);
        let m = (s - g * g).sqrt();
        let time = (m * v).atan2(g * v + s * u) / m;
        let depth = (-g * time).exp() * (v * (v + 2.0 * g * u) + s * u * u).sqrt() / w - u;
        assert!(relative(flight.end.time, time) < 1e-14 && relative(flight.end.depth, depth) < 1e-14, "{flight:?}");
    }

    #[test]
    fn the_last_step_of_the_budget_may_end_a_flight_and_no_other_follows() {
        let problem = alone(Stage::tunnel(1.0, 0.0), f64::INFINITY);
        let mut course = course_at(&problem, 0.0, 3.0);
        course.cost.steps = STEPS_MAX - 1;
        assert!(course.cross_stage().is_ok());
        let mut course = course_at(&problem, 0.0, 3.0);
        course.cost.steps = STEPS_MAX;
        assert!(matches!(course.cross_stage(), Err(IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, .. })));
    }

    /// Depth over speed, near both ends of the range of numbers, and a depth that is a multiple of a small speed.
    #[test]
    fn a_gap_of_any_size_is_crossed_at_any_speed() {
        for (speed, depth) in [(1e200, 1e-100), (1e-50, 1e150), (2.0_f64.powi(-60), 1.0)] {
            let flight = fly(&one_stage(Stage::tunnel(0.0, 0.0), speed, depth));
            assert_eq!((flight.end.depth, flight.end.velocity), (depth, speed));
            assert!(relative(flight.end.time, depth / speed) < 1e-15, "{:e}", flight.end.time);
        }
    }

    /// `d + (H - d)`, each rounded, is one spacing short of H.
    #[test]
    fn an_exit_is_at_its_own_depth_where_the_way_to_it_is_rounded() {
        let (d, exit) = (0.5 * f64::EPSILON, 1.0 + 3.0 * f64::EPSILON);
        assert!(d + (exit - d) < exit);
        let gap = Stage::tunnel(0.0, 0.0);
        let mut problem = one_stage(gap, 1.0, exit);
        problem.stages.insert(0, Stage { end: d, ..gap });
        let flight = fly(&problem);
        assert_eq!(kinds(&flight), [EventKind::StageEnd(0), EventKind::Exit]);
        assert_eq!((flight.end.depth, flight.cost.steps), (exit, 2));
    }

    /// F = 1, M = 1, V0 = 1: W/V0² = 1 - 2 H. Eight roundings of it are allowed, and a few of 1 for the way to rest.
    #[test]
    fn the_bar_of_a_deep_stop_is_that_of_the_way_it_lacks() {
        let flight = fly(&one_stage(Stage::tunnel(1.0, 0.0), 1.0, 1000.0));
        assert_eq!(flight.exit_margin, Some(-1999.0));
        let units = flight.exit_margin_error.unwrap() / f64::EPSILON / 1999.0;
        assert!(units > 8.0 && units < 8.02, "{units}");
    }

    /// Theory section 2, `p, s`: a boundary at which a twentieth of the energy is left, in units that are not the step's.
    #[test]
    fn a_boundary_that_takes_nearly_all_energy_is_within_reach() {
        let (p, s, v, way) = (6.0, 400.0_f64, 10.0, 0.473);
        let law = Stage { static_force: p, stiffness: s, viscosity: 0.0, drag: 0.0, end: way };
        let series = Series::<f64, 24>::new::<true, false, false>(&law, v);
        let start = State { time: 0.0, depth: 0.0, velocity: v };
        let w = s.sqrt();
        let Step::Limit(found) = search(&law, &series, start, PHASE_MAX / w, &Closing::new(f64::EPSILON)) else {
            panic!("the boundary is missed")
        };
        let (u0, u) = (p / s, way + p / s);
        let velocity = (v * v - way * (2.0 * p + s * way)).sqrt();
        let time = (w * (u * v - u0 * velocity)).atan2(velocity * v + s * u * u0) / w;
        assert!(relative(found.velocity, velocity) < 1e-13 && relative(found.time, time) < 1e-14, "{found:?}");
    }

    /// The method over depth has no root to isolate in time.
    #[test]
    fn rest_against_stiffness_and_drag_is_found_to_the_digits_of_double_double() {
        for (p, s, q) in [(7.0, 11.0, 0.5), (0.0, 3.0, 2.0), (-4.0, 30.0, 0.1)] {
            let law = Stage { static_force: p, stiffness: s, viscosity: 0.0, drag: q, end: f64::INFINITY };
            let problem = one_stage(law, 5.0, f64::INFINITY).cast::<TwoFloat>();
            let end = Taylor::default().fly_in(&problem, Detail::End).unwrap().end;
            let other = Energy::new().fly_in(&problem, Detail::End).unwrap().end;
            for (value, exact) in [(end.depth, other.depth), (end.time, other.time)] {
                let off = (value - exact).value().abs() / exact.value();
                assert!(off < 1e-28, "{p}, {s}, {q}: {off:e}");
            }
        }
    }

    #[test]
    fn every_entry_of_the_table_is_the_reciprocal_of_its_place() {
        for (k, entry) in RECIPROCALS.iter().enumerate().skip(1) {
            assert!((entry * k as f64 - 1.0).abs() <= 0.5 * f64::EPSILON, "{k}: {entry}");
        }
    }
}
