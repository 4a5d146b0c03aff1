//! The paper's explicit central difference scheme, with every choice that decides its order made visible.
//!
//! ```text
//! V(i+1/2) = V(i-1/2) + (dt(i+1) + dt(i))/2 a(i)        (Eq. 6)
//! x(i+1)   = x(i) + dt(i+1) V(i+1/2)                    (Eq. 7)
//! a(i)     = -F(x(i), V*)/M                             (Eq. 8)
//! V(-1/2)  = V0 - dt(1)/2 a(0),   a(0) = -F(0, V0)/M,   dt(0) = dt(1)
//! ```
//!
//! The state of step i is `(t(i), x(i), V(i))` with `V(i) = V(i-1/2) + dt(i)/2 a(i)`. With equal steps its time is
//! `i dt`, never a running sum, which is off by 4e-11 after 1e6 steps. Two choices decide the order: the velocity V*
//! in the force ([`VelocityAt`]) and the treatment of stage ends, exit and rest ([`Boundaries`]);
//! [`crate::studies::formal_order()`] knows the order of each combination.
//!
//! # Inside a step
//! Where a place inside a step is asked for, V runs linearly from V(i) to V(i+1), and x along the parabola
//! `x(i) + V(i) tau + a(i) tau²/2`, which meets x(i+1) exactly: a place between two nodes is always found, with one
//! square root and no iteration. Whole steps decide whether something happened: a stage end or the exit when x(i+1)
//! has reached it, rest when V(i+1) <= 0; in a step that comes to rest, also a place that the parabola touches before.
//!
//! # Source
//! Central difference operator of the paper, Eq. 6-8; orders, error constants and limits: theory section 5.

use clap::ValueEnum;
use serde::Deserialize;

use super::outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Sample, StepLimit};
use crate::physics::exit_energy::exit_margin;
use crate::physics::{Event, EventKind, Outcome, Problem, Scalar, Stage, State};

/// Name of the method in the contract.
pub const NAME: &str = "central-difference";

/// Default of [`CentralDifference::max_steps`]: about half a second of flight.
pub const MAX_STEPS: u64 = 100_000_000;

/// Whole steps in the shortest time scale of the stages, for [`Steps::Default`].
const STEPS_PER_SHORTEST_SCALE: f64 = 1e3;

/// Most whole steps in the longest time scale of the stages, for [`Steps::Default`]: a crater of 1e-8 diameters
/// deserves no 1e11 steps.
const STEPS_PER_LONGEST_SCALE: f64 = 1e6;

/// Largest part of the stability limit that [`Steps::Default`] uses.
const PART_OF_LIMIT: f64 = 0.25;

/// Steps without any change of x and V after which a flight counts as stuck for ever.
const STUCK_STEPS: u64 = 1 << 20;

/// Sizes of the time steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Steps {
    /// Chosen from the stages by [`default_time_step`].
    #[default]
    Default,
    /// Equal steps [s].
    Uniform(f64),
    /// A sequence of sizes [s], taken in order and started over when it is used up: two entries alternate. A step
    /// that [`Boundaries::Landed`] shortens uses up its entry.
    Given(Vec<f64>),
}

/// The velocity V* at which the force of step i is evaluated.
///
/// Where no force on the path depends on the velocity (the crater, a tunnel with Q = 0) all three are the same scheme.
/// At impact, and where [`Boundaries::Landed`] restarts at a stage end, V(i) itself is known and every rule uses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum, Deserialize)]
pub enum VelocityAt {
    /// `V* = V(i-1/2)`, which an explicit finite-element code hands to a user's subroutine: the paper's choice.
    /// First order as soon as the force depends on the velocity.
    #[default]
    #[value(name = "lagged")]
    #[serde(rename = "lagged")]
    LaggedHalfStep,
    /// `V* = V(i)`: the quadratic `V = V(i-1/2) - dt(i)/2 F(x(i), V)/M` solved for V. Second order; unconditionally
    /// stable as far as the drag goes. One evaluation, one square root and one division a step.
    #[value(name = "centred")]
    #[serde(rename = "centred")]
    Centred,
    /// `V* = V(i-1/2) - dt(i)/2 F(x(i), V(i-1/2))/M`: half a step ahead with the lagged force. Second order; two
    /// evaluations a step, and no equation to solve.
    #[value(name = "predicted")]
    #[serde(rename = "predicted")]
    PredictedHalfStep,
}

/// What is done about stage ends, exit depth and rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum, Deserialize)]
pub enum Boundaries {
    /// Seen at the first whole step past them, the state not moved back: the paper's choice. Rest at the first
    /// V(i) <= 0, its depth the larger of the last two x.
    #[default]
    #[value(name = "step-end")]
    #[serde(rename = "step-end")]
    StepEnd,
    /// Located inside the step afterwards; the steps themselves are those of [`Boundaries::StepEnd`].
    #[value(name = "interpolated")]
    #[serde(rename = "interpolated")]
    Interpolated,
    /// Stage ends are landed on: the step is shortened to `x(i) + V(i) dt + a(i) dt²/2 = end`, and the scheme starts
    /// afresh there, each half step with the force of its own side; the next step has its regular size again. Exit
    /// and rest are located inside the step. The only rule that keeps second order at a jump of the force.
    #[value(name = "landed")]
    #[serde(rename = "landed")]
    Landed,
}

/// How x and V are summed up over the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Summation {
    /// One rounding an addition.
    #[default]
    #[value(name = "plain")]
    Plain,
    /// Kahan's: what an addition rounds off is carried to the next one. Lowers the round-off floor of long runs.
    #[value(name = "compensated")]
    Compensated,
}

/// Writes `Display` by the names of `ValueEnum`, and `FromStr` as its inverse, so that each name stands once.
macro_rules! named_option {
    ($type:ty, $option:literal, $allowed:literal) => {
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                self.to_possible_value().map_or(Ok(()), |value| f.pad(value.get_name()))
            }
        }

        impl std::str::FromStr for $type {
            type Err = IntegrationError;

            fn from_str(name: &str) -> Result<Self, Self::Err> {
                <Self as ValueEnum>::from_str(name, false).map_err(|_| IntegrationError::BadOption {
                    option: $option,
                    value: name.to_owned(),
                    allowed: $allowed,
                })
            }
        }
    };
}

named_option!(VelocityAt, "--velocity", "lagged, centred or predicted");
named_option!(Boundaries, "--events", "step-end, interpolated or landed");
named_option!(Summation, "summation", "plain or compensated");

/// The central difference scheme. The default is the paper's: lagged velocity, boundaries at step ends.
///
/// The outcome is the scheme's own at its step, without an error bar: never `Undecided`.
#[derive(Clone, Debug, PartialEq)]
pub struct CentralDifference {
    /// Sizes of the time steps.
    pub steps: Steps,
    /// Velocity in the force.
    pub velocity: VelocityAt,
    /// Treatment of stage ends, exit and rest.
    pub boundaries: Boundaries,
    /// Summation of x and V.
    pub summation: Summation,
    /// Steps allowed, at least 1.
    pub max_steps: u64,
}

impl Default for CentralDifference {
    fn default() -> Self {
        Self {
            steps: Steps::default(),
            velocity: VelocityAt::default(),
            boundaries: Boundaries::default(),
            summation: Summation::default(),
            max_steps: MAX_STEPS,
        }
    }
}

impl Integrator for CentralDifference {
    fn name(&self) -> &'static str {
        NAME
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        self.fly_in(problem, detail)
    }
}

impl CentralDifference {
    /// The scheme with equal steps of `time_step` [s] and plain sums.
    pub fn uniform(time_step: f64, velocity: VelocityAt, boundaries: Boundaries) -> Self {
        Self { steps: Steps::Uniform(time_step), velocity, boundaries, ..Self::default() }
    }

    /// The step [s] with which `problem` is flown: what a report prints. Of a given sequence, its largest.
    pub fn time_step<S: Scalar>(&self, problem: &Problem<S>) -> f64 {
        match &self.steps {
            Steps::Default => default_time_step(problem, self.velocity),
            Steps::Uniform(time_step) => *time_step,
            Steps::Given(sizes) => sizes.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Flies `problem` in any number type; [`Integrator::fly`] is this in `f64`.
    ///
    /// Evaluations of the force: one at impact, one a step (two for [`VelocityAt::PredictedHalfStep`]), and one more
    /// at each stage end that is landed on. A step is rejected only when a landing is found within a step that was
    /// complete already (it came to rest and turned back before its end).
    ///
    /// # Errors
    /// - `BadOption`: a step or budget that is not positive and finite;
    /// - `StepBudgetSpent`: no end within [`Self::max_steps`];
    /// - `NotFinite`: x or V overflowed, as beyond the stability limit they may;
    /// - `NeverEnds`: no exit depth, and a last stage without a static force that resists; or the velocity died out
    ///   without a force at rest.
    pub fn fly_in<S: Scalar>(&self, problem: &Problem<S>, detail: Detail) -> Result<Flight<S>, IntegrationError> {
        self.check::<S>()?;
        if let Some(flight) = Flight::<f64>::at_once(problem) {
            return Ok(flight);
        }
        self.dispatch(problem, Fly { detail })
    }

    /// The first `count` states of the scheme in the first stage, with all events off: the stage has no end, and the
    /// velocity may change its sign. For the study of stability and of round-off.
    ///
    /// # Errors
    /// `BadOption` as in [`Self::fly_in`]. States may overflow to infinity and NaN: that is what they are for.
    pub fn free_states<S: Scalar>(
        &self,
        problem: &Problem<S>,
        count: usize,
    ) -> Result<Vec<State<S>>, IntegrationError> {
        self.check::<S>()?;
        self.dispatch(problem, Free { count })
    }

    /// The states of the scheme under an outer force `source(j, t)` [N] that drives, the stages parted by time:
    /// `M x'' = -F_j(x, x') + source(j, t)` until `ends[j]` [s], ascending, which is landed on as
    /// [`Boundaries::Landed`] lands on a stage end. All other events are off. For manufactured solutions.
    ///
    /// # Errors
    /// `BadOption` as in [`Self::fly_in`], or `ends` without a stage each; `StepBudgetSpent` before the last end. As
    /// with [`Self::free_states`] overflow is no error.
    pub fn forced_states<S: Scalar>(
        &self,
        problem: &Problem<S>,
        source: impl Fn(usize, S) -> S,
        ends: &[f64],
    ) -> Result<Vec<State<S>>, IntegrationError> {
        self.check::<S>()?;
        if ends.is_empty() || ends.len() > problem.stages.len() {
            let (option, value, allowed) = ("ends", format!("{} times", ends.len()), "one for each stage flown");
            return Err(IntegrationError::BadOption { option, value, allowed });
        }
        self.dispatch(problem, Forced { source, ends })
    }

    /// Refuses options outside their domain, as numbers of type `S`.
    fn check<S: Scalar>(&self) -> Result<(), IntegrationError> {
        let bad = |option, value: String, allowed| Err(IntegrationError::BadOption { option, value, allowed });
        let admissible = |size: f64| {
            let size = S::from_f64(size).value();
            size > 0.0 && size.is_finite()
        };
        if self.max_steps == 0 {
            return bad("max_steps", "0".to_owned(), "at least 1");
        }
        match &self.steps {
            Steps::Default => Ok(()),
            Steps::Uniform(size) if admissible(*size) => Ok(()),
            Steps::Uniform(size) => bad("--dt", format!("{size} s"), "a positive, finite time"),
            Steps::Given(sizes) => match sizes.iter().find(|size| !admissible(**size)) {
                Some(size) => bad("steps", format!("{size} s"), "positive, finite times"),
                None if sizes.is_empty() => bad("steps", "[]".to_owned(), "at least one time step"),
                None => Ok(()),
            },
        }
    }

    /// Picks the clock, the sum and the velocity rule once, so that the loop over steps holds none of the choices.
    fn dispatch<S: Scalar, J: Job<S>>(&self, problem: &Problem<S>, job: J) -> Result<J::Answer, IntegrationError> {
        match &self.steps {
            Steps::Given(sizes) => self.dispatch_sum(problem, Sequence::new(sizes), job),
            _ => self.dispatch_sum(problem, Equal::new(S::from_f64(self.time_step(problem))), job),
        }
    }

    fn dispatch_sum<S: Scalar, C: Clock<S>, J: Job<S>>(
        &self,
        problem: &Problem<S>,
        clock: C,
        job: J,
    ) -> Result<J::Answer, IntegrationError> {
        match self.summation {
            Summation::Plain => self.dispatch_rule::<S, Plain<S>, C, J>(problem, clock, job),
            Summation::Compensated => self.dispatch_rule::<S, Kahan<S>, C, J>(problem, clock, job),
        }
    }

    fn dispatch_rule<S: Scalar, A: Sum<S>, C: Clock<S>, J: Job<S>>(
        &self,
        problem: &Problem<S>,
        clock: C,
        job: J,
    ) -> Result<J::Answer, IntegrationError> {
        match self.velocity {
            VelocityAt::LaggedHalfStep => fault!(
                "lag-removed",
                job.run(Scheme::<S, A, C, Lagged>::new(self, problem, clock)),
                job.run(Scheme::<S, A, C, Predicted>::new(self, problem, clock))
            ),
            VelocityAt::Centred => job.run(Scheme::<S, A, C, Centred>::new(self, problem, clock)),
            VelocityAt::PredictedHalfStep => job.run(Scheme::<S, A, C, Predicted>::new(self, problem, clock)),
        }
    }
}

/// Whether `time` [s] is less than a thousandth of what any flight lasts: told after the first steps and not after a
/// hundred million, which take half a minute where their changes of depth are numbers of less than 53 bits.
///
/// While every stage only resists, `x <= V0 t` and `V >= V0 - t F_max/M`, `F_max` the largest force up to that depth at
/// V0: neither the exit is reached nor rest.
fn cannot_end<S: Scalar>(problem: &Problem<S>, time: f64) -> bool {
    let (mass, speed, time) = (problem.mass.value(), problem.impact_speed.value(), 1e3 * time);
    let reach = speed * time;
    let mut met =
        (0..problem.stages.len()).filter(|&i| problem.start_of(i).value() <= reach).map(|i| &problem.stages[i]);
    let stays_in_flight = |law: &Stage<S>| {
        let force = law.force(S::from_f64(reach), problem.impact_speed).value();
        law.static_force.value() >= 0.0 && time * force < mass * speed
    };
    reach < problem.exit_depth.value() && met.all(stays_in_flight)
}

/// The default time step [s], from the coefficients of the stages and the impact speed alone.
///
/// A thousandth of the shortest time scale among the stages that start before the exit: `sqrt(M/s)` (half of 2/w),
/// `M/(q V0)`, `M/r`, `M V0/|p + s x|` at both ends, and the crossing time of the stage at V0. But not less than a
/// millionth of the longest time that V0 alone would let a stage last, and at most a quarter of the stability limit
/// at V0. A heuristic: it resolves the paper's scenes in 10³ to 10⁵ steps, and promises nothing about the error.
pub fn default_time_step<S: Scalar>(problem: &Problem<S>, velocity: VelocityAt) -> f64 {
    let (mass, speed) = (problem.mass.value(), problem.impact_speed.value());
    let mut shortest = f64::INFINITY;
    let mut longest: f64 = 0.0;
    let mut limit = f64::INFINITY;
    for (index, stage) in problem.stages.iter().enumerate() {
        let (from, to) = (problem.start_of(index).value(), problem.limit_of(index).value());
        if to <= from {
            continue;
        }
        let (p, s) = (stage.static_force.value(), stage.stiffness.value());
        let (r, q) = (stage.viscosity.value(), stage.drag.value());
        let crossing = (to - from) / speed;
        let swing = (mass / s).sqrt();
        // A spring cannot be compressed further than V0/w beyond the start of its stage.
        let farthest = to.min(from + speed * swing);
        let weakening = if s > 0.0 { (p + s * farthest).abs() } else { 0.0 };
        let stopping = mass * speed / (p + s * from).abs().max(weakening);
        let ratios = [crossing, swing, stopping, mass / r, mass / (q * speed)];
        let fastest = ratios.into_iter().filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
        let slowest = [crossing, swing, mass * speed / p.abs(), mass / (p.abs() * q).sqrt()];
        let slowest = slowest.into_iter().filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
        shortest = shortest.min(fastest);
        if slowest.is_finite() {
            longest = longest.max(slowest);
        }
        limit = limit.min(stability_limit(stage, mass, speed, velocity));
    }
    let step = (shortest / STEPS_PER_SHORTEST_SCALE).max(longest / STEPS_PER_LONGEST_SCALE).min(PART_OF_LIMIT * limit);
    // A target that does nothing has no scale at all; any step then gives the same flight. Nor may the choice
    // underflow or overflow, whatever the scene.
    if step.is_finite() { step.max(f64::MIN_POSITIVE) } else { 1.0 }
}

/// The largest stable step [s] in `stage` at speed `speed` [m/s]; infinite where there is none.
///
/// With `w² = s/M` and `g = (r + 2 q V)/M`, the rate of the linearised drag, the two roots of the scheme's
/// characteristic polynomial stay within the unit circle for
///
/// ```text
/// lagged:     (w dt)² + 2 g dt < 4                      dt < 2/w without drag, dt < 2/g without stiffness
/// centred:    w dt < 2                                  whatever the drag
/// predicted:  (w dt)² (1 - b) < 4 (1 - b + b²), b < 1   b = g dt/2
/// ```
///
/// The limit itself is excluded: at `w dt = 2` amplitudes grow linearly. Between half of the limit and the limit the
/// lagged drag alternates about the solution instead of approaching it from one side.
///
/// # Source
/// Theory section 5 for each term alone; the combined forms by the criterion of Schur and Cohn.
pub fn stability_limit<S: Scalar>(stage: &Stage<S>, mass: f64, speed: f64, velocity: VelocityAt) -> f64 {
    let w_squared = stage.stiffness.value() / mass;
    let w = w_squared.sqrt();
    let g = (stage.viscosity.value() + 2.0 * stage.drag.value() * speed) / mass;
    match velocity {
        VelocityAt::LaggedHalfStep => fault!("stability-limit", 4.0, 2.0) / (g + g.hypot(2.0 * w)),
        VelocityAt::Centred => 2.0 / w,
        VelocityAt::PredictedHalfStep => {
            // dt = (2/w) sqrt((1 - b + b²)/(1 - b)) as a fixed point: the right side grows with dt, so the iteration
            // climbs from 2/w to the first root, or past b = 1 when there is none.
            let mut limit = 2.0 / w;
            for _ in 0..200 {
                let b = 0.5 * g * limit;
                if b.is_nan() || b >= 1.0 {
                    return 2.0 / g;
                }
                let next = 2.0 / w * ((1.0 - b + b * b) / (1.0 - b)).sqrt();
                if next <= limit {
                    break;
                }
                limit = next;
            }
            limit
        }
    }
}

/// The force rule of one stage, divided by the mass: [`Stage::force`] of it is the deceleration [m/s²].
fn per_mass<S: Scalar>(stage: &Stage<S>, mass: S) -> Stage<S> {
    Stage {
        static_force: stage.static_force.over(mass),
        stiffness: stage.stiffness.over(mass),
        viscosity: stage.viscosity.over(mass),
        drag: stage.drag.over(mass),
        end: stage.end,
    }
}

/// [`VelocityAt`] as a type, so that the loop over steps is compiled for one rule.
trait Rule {
    /// Evaluations of the force in one step.
    const EVALUATIONS: u64;

    /// Deceleration F/M at depth `x`, from the velocity `u` half a step `half` before.
    fn deceleration<S: Scalar>(law: &Stage<S>, x: S, u: S, half: S) -> S;
}

struct Lagged;

impl Rule for Lagged {
    const EVALUATIONS: u64 = 1;

    #[inline]
    fn deceleration<S: Scalar>(law: &Stage<S>, x: S, u: S, _half: S) -> S {
        law.force(x, u)
    }
}

struct Centred;

impl Rule for Centred {
    const EVALUATIONS: u64 = 1;

    #[inline]
    fn deceleration<S: Scalar>(law: &Stage<S>, x: S, u: S, half: S) -> S {
        // half q V² + (1 + half r) V = u - half (p + s x), in the form that does not cancel for small drag.
        let known = u - half * (law.static_force + law.stiffness * x);
        let linear = S::one() + half * law.viscosity;
        let discriminant =
            linear * linear + S::from_f64(fault!("centred-quadratic", 4.0, 2.0)) * half * law.drag * known;
        // Without a real root the step goes far past rest; the vertex of the parabola is as negative as it gets.
        let root = if discriminant.value() > 0.0 { discriminant.sqrt() } else { S::zero() };
        law.force(x, fault!("lag-added", (S::from_f64(2.0) * known).over(linear + root), u))
    }
}

struct Predicted;

impl Rule for Predicted {
    const EVALUATIONS: u64 = 2;

    #[inline]
    fn deceleration<S: Scalar>(law: &Stage<S>, x: S, u: S, half: S) -> S {
        law.force(x, u - fault!("predicted-whole-step", half, half + half) * law.force(x, u))
    }
}

/// [`Summation`] as a type.
trait Sum<S: Scalar>: Copy {
    fn new(value: S) -> Self;
    #[must_use]
    fn plus(self, increment: S) -> Self;
    fn value(self) -> S;
}

#[derive(Clone, Copy)]
struct Plain<S>(S);

impl<S: Scalar> Sum<S> for Plain<S> {
    #[inline]
    fn new(value: S) -> Self {
        Self(value)
    }

    #[inline]
    fn plus(self, increment: S) -> Self {
        Self(self.0 + increment)
    }

    #[inline]
    fn value(self) -> S {
        self.0
    }
}

#[derive(Clone, Copy)]
struct Kahan<S> {
    sum: S,
    /// What the last addition rounded off.
    lost: S,
}

impl<S: Scalar> Sum<S> for Kahan<S> {
    #[inline]
    fn new(value: S) -> Self {
        Self { sum: value, lost: S::zero() }
    }

    #[inline]
    fn plus(self, increment: S) -> Self {
        let increment = increment + self.lost;
        let sum = self.sum + increment;
        Self { sum, lost: increment - (sum - self.sum) }
    }

    #[inline]
    fn value(self) -> S {
        self.sum
    }
}

/// [`Steps`] as a type: the size of the step ahead, and the time that the steps behind add up to.
trait Clock<S: Scalar> {
    /// Size of the next step [s].
    fn step(&self) -> S;
    /// A whole step was taken.
    fn tick(&mut self);
    /// A step was shortened to `part` [s].
    fn tick_part(&mut self, part: S);
    /// Time since impact [s].
    fn now(&self) -> S;
}

struct Equal<S> {
    size: S,
    /// Time of the impact or of the last landing.
    since: S,
    /// Whole steps since then.
    count: u64,
}

impl<S: Scalar> Equal<S> {
    fn new(size: S) -> Self {
        Self { size, since: S::zero(), count: 0 }
    }
}

impl<S: Scalar> Clock<S> for Equal<S> {
    #[inline]
    fn step(&self) -> S {
        self.size
    }

    #[inline]
    fn tick(&mut self) {
        fault!("running-sum-time", self.count += 1, self.since += self.size);
    }

    fn tick_part(&mut self, part: S) {
        self.since = self.now() + part;
        self.count = 0;
    }

    fn now(&self) -> S {
        self.since + S::from_f64(self.count as f64) * self.size
    }
}

struct Sequence<'a, S> {
    sizes: &'a [f64],
    next: usize,
    time: Kahan<S>,
}

impl<'a, S: Scalar> Sequence<'a, S> {
    fn new(sizes: &'a [f64]) -> Self {
        Self { sizes, next: 0, time: Kahan::new(S::zero()) }
    }
}

impl<S: Scalar> Clock<S> for Sequence<'_, S> {
    #[inline]
    fn step(&self) -> S {
        S::from_f64(self.sizes[self.next])
    }

    #[inline]
    fn tick(&mut self) {
        self.tick_part(self.step());
    }

    #[inline]
    fn tick_part(&mut self, part: S) {
        self.time = self.time.plus(part);
        self.next = if self.next + 1 == self.sizes.len() { 0 } else { self.next + 1 };
    }

    fn now(&self) -> S {
        self.time.value()
    }
}

/// What the scheme carries from step to step.
#[derive(Clone, Copy)]
struct Node<S, A> {
    /// x(i).
    x: A,
    /// V(i-1/2).
    u: A,
    /// V(i).
    v: S,
    /// Deceleration -a(i).
    d: S,
    /// dt(i).
    h: S,
}

/// Why [`cruise`] stopped before a step.
enum Pause<S, A> {
    /// It took as many steps as it was allowed.
    Allowance,
    /// The next step reaches the limit in x (or x is NaN). Its force is not evaluated: boundaries decide in which stage.
    Crossing {
        /// x(i+1).
        x: A,
        /// V(i+1/2).
        u: A,
    },
    /// The next step comes to rest (or V is NaN) before the limit.
    Rest(Node<S, A>),
}

/// What [`cruise`] did.
struct Leg<S, A> {
    taken: u64,
    speed_max: f64,
    step_max: f64,
    pause: Pause<S, A>,
}

/// Takes whole steps inside one stage for as long as nothing happens: the loop in which the time goes.
#[inline]
fn cruise<S: Scalar, A: Sum<S>, C: Clock<S>, R: Rule>(
    node: &mut Node<S, A>,
    clock: &mut C,
    law: &Stage<S>,
    limit: f64,
    allowance: u64,
) -> Leg<S, A> {
    let half = S::from_f64(0.5);
    let law = *law;
    let mut here = *node;
    let mut taken = 0;
    let mut speed_max = here.v.value();
    let mut step_max: f64 = 0.0;
    let pause = loop {
        if taken == allowance {
            break Pause::Allowance;
        }
        let h = clock.step();
        let u = here.u.plus(-(half * (fault!("kick-next-step", here.h, h) + h) * here.d));
        let x = here.x.plus(fault!("kick-last-step", h, here.h) * u.value());
        // Both tests are written so that NaN leaves the loop.
        let inside = x.value().value() < limit;
        if !inside {
            break Pause::Crossing { x, u };
        }
        step_max = step_max.max(h.value());
        let d = R::deceleration(&law, x.value(), u.value(), half * h);
        let next = Node { x, u, v: u.value() - half * h * d, d, h };
        let moving = fault!("rest-half-step-late", next.v, next.u.value()).value() > 0.0;
        if !moving {
            break Pause::Rest(next);
        }
        here = next;
        clock.tick();
        taken += 1;
        speed_max = speed_max.max(here.v.value());
    };
    *node = here;
    Leg { taken, speed_max, step_max, pause }
}

/// A step in which something happens, from one state to the next; the velocity at its end may be negative.
struct Step<S> {
    from: State<S>,
    to: State<S>,
    /// -a(i).
    deceleration: S,
    size: S,
}

impl<S: Scalar> Step<S> {
    /// Time into the step at which V = 0, if V(i+1) <= 0.
    fn rest(&self) -> Option<S> {
        (self.to.velocity.value() <= 0.0).then(|| {
            fault!(
                "rest-not-located",
                (self.size * self.from.velocity).over(self.from.velocity - self.to.velocity),
                self.size
            )
        })
    }

    /// Depth after `tau`, on the parabola.
    fn depth(&self, tau: S) -> S {
        if tau.value() >= self.size.value() {
            return self.to.depth;
        }
        self.from.depth
            + tau * (self.from.velocity - S::from_f64(fault!("parabola-half", 0.5, 1.0)) * tau * self.deceleration)
    }

    /// Velocity after `tau`, on the chord; not below zero.
    fn velocity(&self, tau: S) -> S {
        let v = self.from.velocity
            + fault!("velocity-not-interpolated", tau.over(self.size), S::one())
                * (self.to.velocity - self.from.velocity);
        if v.value() > 0.0 { v } else { S::zero() }
    }

    /// When the parabola first comes to depth `place`, if it ever does.
    fn passage(&self, place: S) -> Option<S> {
        let distance = place - self.from.depth;
        let v = self.from.velocity;
        let discriminant = v * v - S::from_f64(2.0) * self.deceleration * distance;
        (discriminant.value() >= 0.0).then(|| {
            (S::from_f64(2.0) * distance).over(fault!(
                "passage-wrong-root",
                v + discriminant.sqrt(),
                v - discriminant.sqrt()
            ))
        })
    }

    /// When depth `place` is reached within the step, before rest or with it; `None` if it is not.
    fn reach(&self, place: S) -> Option<S> {
        let rest = self.rest();
        let last = rest.unwrap_or(self.size);
        let passage = self.passage(place).filter(|tau| tau.value() <= last.value());
        if self.depth(last).value() >= place.value() {
            return Some(passage.unwrap_or(last));
        }
        // Whole steps decide; only on the way to rest may the parabola have turned after touching the place.
        rest.and(passage)
    }

    /// State at `tau`, where the depth is known to be `depth`.
    fn at(&self, tau: S, depth: S) -> State<S> {
        State { time: self.from.time + tau, depth, velocity: self.velocity(tau) }
    }
}

/// A flight, or anything else, that a scheme is asked for.
trait Job<S: Scalar> {
    type Answer;
    fn run<A: Sum<S>, C: Clock<S>, R: Rule>(
        self,
        scheme: Scheme<'_, S, A, C, R>,
    ) -> Result<Self::Answer, IntegrationError>;
}

/// The scheme on its way through a problem.
struct Scheme<'a, S, A, C, R> {
    options: &'a CentralDifference,
    problem: &'a Problem<S>,
    clock: C,
    /// Stage that gives the force at the node.
    stage: usize,
    law: Stage<S>,
    node: Node<S, A>,
    cost: Cost,
    /// Largest V(i) and dt in this stage.
    speed_max: f64,
    step_max: f64,
    step_limit: StepLimit,
    rule: std::marker::PhantomData<R>,
}

impl<'a, S: Scalar, A: Sum<S>, C: Clock<S>, R: Rule> Scheme<'a, S, A, C, R> {
    fn new(options: &'a CentralDifference, problem: &'a Problem<S>, clock: C) -> Self {
        let impact = State::at_impact(problem);
        let nothing = Node { x: A::new(S::zero()), u: A::new(S::zero()), v: S::zero(), d: S::zero(), h: S::zero() };
        let mut scheme = Self {
            options,
            problem,
            clock,
            stage: 0,
            law: per_mass(&problem.stages[0], problem.mass),
            node: nothing,
            cost: Cost::default(),
            speed_max: 0.0,
            step_max: 0.0,
            step_limit: StepLimit { limit: f64::INFINITY, stable: true },
            rule: std::marker::PhantomData,
        };
        scheme.enter_stage_at(impact.depth);
        scheme.start(impact);
        scheme
    }

    /// The node at a state known by its velocity: `V(i-1/2) = V(i) - dt/2 a(i)`, so that Eq. 6 goes on from it.
    fn start(&mut self, state: State<S>) {
        let h = self.clock.step();
        let d = self.law.force(state.depth, state.velocity);
        let u = A::new(state.velocity + S::from_f64(fault!("start-half-step", 0.5, -0.5)) * h * d);
        self.node = Node { x: A::new(state.depth), u, v: state.velocity, d, h };
        self.cost.force_evaluations += 1;
    }

    fn state(&self) -> State<S> {
        State { time: self.clock.now(), depth: self.node.x.value(), velocity: self.node.v }
    }

    /// Moves on to the stage whose force holds at depth `x`: beyond every end at or before `x`.
    ///
    /// An end at the exit depth, or past it, changes nothing: the flight does not go there.
    fn enter_stage_at(&mut self, x: S) {
        let before = self.stage;
        while self.problem.stages[self.stage].end.value() <= x.value()
            && self.problem.stages[self.stage].end.value() < self.problem.exit_depth.value()
        {
            self.stage += 1;
        }
        if self.stage != before {
            self.leave_stage(before);
            self.law = per_mass(&self.problem.stages[self.stage], self.problem.mass);
        }
    }

    /// Accounts for the step limit of a stage that was flown through.
    fn leave_stage(&mut self, stage: usize) {
        if self.step_max > 0.0 {
            let law = &self.problem.stages[stage];
            let limit = stability_limit(law, self.problem.mass.value(), self.speed_max, self.options.velocity);
            self.step_limit.limit = self.step_limit.limit.min(limit);
            self.step_limit.stable &= self.step_max < limit;
        }
        self.speed_max = 0.0;
        self.step_max = 0.0;
    }

    /// Whole steps up to the next thing that happens.
    fn cruise(&mut self, limit: f64, allowance: u64) -> Pause<S, A> {
        let leg = cruise::<S, A, C, R>(&mut self.node, &mut self.clock, &self.law, limit, allowance);
        self.cost.steps += leg.taken;
        self.cost.force_evaluations += leg.taken * R::EVALUATIONS;
        self.speed_max = self.speed_max.max(leg.speed_max);
        self.step_max = self.step_max.max(leg.step_max);
        leg.pause
    }

    /// The node reached with V(i+1/2) = `u` at depth `x` by a step of size `h`, with the force of the present stage.
    fn arrive(&mut self, x: A, u: A, h: S) -> Node<S, A> {
        let half = S::from_f64(0.5) * h;
        let d = R::deceleration(&self.law, x.value(), u.value(), half);
        self.cost.force_evaluations += R::EVALUATIONS;
        Node { x, u, v: u.value() - half * d, d, h }
    }

    /// A step of size `h` by Eq. 6-7, whatever lies in its way; the clock is not told.
    fn advance(&mut self, h: S) {
        let u = self.node.u.plus(-(S::from_f64(0.5) * (self.node.h + h) * self.node.d));
        let x = self.node.x.plus(h * u.value());
        self.node = self.arrive(x, u, h);
    }

    /// The step from the present node to `next`; its time is told by the clock, once that has ticked.
    fn step_to(&self, next: &Node<S, A>) -> Step<S> {
        let from = self.state();
        let to = State { depth: next.x.value(), velocity: next.v, ..from };
        Step { from, to, deceleration: self.node.d, size: next.h }
    }

    fn finite(&self, what: &'static str, number: S) -> Result<(), IntegrationError> {
        if number.value().is_finite() {
            return Ok(());
        }
        Err(IntegrationError::NotFinite { what, last: self.state().values() })
    }
}

/// [`CentralDifference::free_states`].
struct Free {
    count: usize,
}

impl<S: Scalar> Job<S> for Free {
    type Answer = Vec<State<S>>;

    fn run<A: Sum<S>, C: Clock<S>, R: Rule>(
        self,
        mut scheme: Scheme<'_, S, A, C, R>,
    ) -> Result<Self::Answer, IntegrationError> {
        let mut states = Vec::with_capacity(self.count);
        for _ in 0..self.count {
            states.push(scheme.state());
            let h = scheme.clock.step();
            scheme.advance(h);
            scheme.clock.tick();
        }
        Ok(states)
    }
}

/// [`CentralDifference::forced_states`].
struct Forced<'a, F> {
    source: F,
    ends: &'a [f64],
}

impl<S: Scalar, F: Fn(usize, S) -> S> Job<S> for Forced<'_, F> {
    type Answer = Vec<State<S>>;

    fn run<A: Sum<S>, C: Clock<S>, R: Rule>(
        self,
        mut scheme: Scheme<'_, S, A, C, R>,
    ) -> Result<Self::Answer, IntegrationError> {
        let mass = scheme.problem.mass;
        let mut states = vec![scheme.state()];
        for (stage, &end) in self.ends.iter().enumerate() {
            let law = per_mass(&scheme.problem.stages[stage], mass);
            // At a given time the outer force is one more static force, whatever the velocity rule makes of the rest.
            let law_at = |time| Stage { static_force: law.static_force - (self.source)(stage, time).over(mass), ..law };
            let start = scheme.state();
            scheme.law = law_at(start.time);
            scheme.start(start);
            let mut landed = false;
            while !landed {
                if states.len() as u64 > scheme.options.max_steps {
                    let (max_steps, last) = (scheme.options.max_steps, scheme.state().values());
                    return Err(IntegrationError::StepBudgetSpent { max_steps, last });
                }
                let (now, h) = (scheme.clock.now(), scheme.clock.step());
                let left = S::from_f64(end) - now;
                landed = left.value() <= h.value();
                let h = if landed { left } else { h };
                scheme.law = law_at(now + h);
                scheme.advance(h);
                if landed {
                    scheme.clock.tick_part(h);
                } else {
                    scheme.clock.tick();
                }
                states.push(scheme.state());
            }
        }
        Ok(states)
    }
}

/// [`CentralDifference::fly_in`].
struct Fly {
    detail: Detail,
}

impl<S: Scalar> Job<S> for Fly {
    type Answer = Flight<S>;

    fn run<A: Sum<S>, C: Clock<S>, R: Rule>(
        self,
        scheme: Scheme<'_, S, A, C, R>,
    ) -> Result<Self::Answer, IntegrationError> {
        Log { scheme, detail: self.detail, events: Events::new(), trajectory: Vec::new() }.fly()
    }
}

/// A scheme and what is written down of its flight.
struct Log<'a, S, A, C, R> {
    scheme: Scheme<'a, S, A, C, R>,
    detail: Detail,
    events: Events<S>,
    trajectory: Vec<Sample>,
}

impl<S: Scalar, A: Sum<S>, C: Clock<S>, R: Rule> Log<'_, S, A, C, R> {
    fn fly(mut self) -> Result<Flight<S>, IntegrationError> {
        let problem = self.scheme.problem;
        // Ends at the face are reached at once; `Scheme::new` has stepped over them.
        for index in 0..self.scheme.stage {
            self.push(EventKind::boundary(problem, index), State::at_impact(problem), index);
        }
        self.record_node();
        // Steps up to the last change of x or V.
        let mut moved = 0;
        let mut is_hope_weighed = false;
        loop {
            self.refuse_endless()?;
            let left = self.scheme.options.max_steps - self.scheme.cost.steps;
            if left == 0 {
                let (max_steps, last) = (self.scheme.options.max_steps, self.scheme.state().values());
                return Err(IntegrationError::StepBudgetSpent { max_steps, last });
            }
            let allowance = if self.detail == Detail::Trajectory { 1 } else { left.min(STUCK_STEPS) };
            let limit = problem.limit_of(self.scheme.stage).value();
            let before = self.scheme.state();
            let ended = match self.scheme.cruise(limit, allowance) {
                Pause::Allowance => false,
                Pause::Crossing { x, u } => {
                    self.scheme.finite("depth", x.value())?;
                    self.cross(x, u)?
                }
                Pause::Rest(next) => {
                    self.scheme.finite("velocity", next.v)?;
                    self.come_to_rest(next)?
                }
            };
            if ended {
                return Ok(self.finish());
            }
            self.record_node();
            let after = self.scheme.state();
            let still =
                (after.depth.value(), after.velocity.value()) == (before.depth.value(), before.velocity.value());
            if !still {
                moved = self.scheme.cost.steps;
            }
            if self.scheme.cost.steps - moved >= STUCK_STEPS {
                let why = "a step no longer changes depth or velocity, which only approach their limits";
                return Err(IntegrationError::NeverEnds { why, last: after.values() });
            }
            if !is_hope_weighed && self.scheme.cost.steps >= STUCK_STEPS {
                is_hope_weighed = true;
                let max_steps = self.scheme.options.max_steps;
                if let Steps::Uniform(step) = self.scheme.options.steps
                    && cannot_end(problem, step * max_steps as f64)
                {
                    return Err(IntegrationError::StepBudgetSpent { max_steps, last: after.values() });
                }
            }
        }
    }

    /// Without a far side, a last stage that does not resist at rest lets the projectile go on for ever.
    fn refuse_endless(&self) -> Result<(), IntegrationError> {
        let stage = &self.scheme.problem.stages[self.scheme.stage];
        let resists = stage.stiffness.value() > 0.0 || stage.static_force.value() > 0.0;
        if resists || self.scheme.problem.has_exit() || stage.end.value().is_finite() {
            return Ok(());
        }
        let why = "no exit depth, and the last stage has no static force that resists";
        Err(IntegrationError::NeverEnds { why, last: self.scheme.state().values() })
    }

    /// The next step reaches a stage end or the exit. Whether the flight ends in it.
    fn cross(&mut self, x: A, u: A) -> Result<bool, IntegrationError> {
        let h = self.scheme.clock.step();
        let end = self.scheme.problem.stages[self.scheme.stage].end;
        let lands = self.scheme.options.boundaries == Boundaries::Landed
            && end.value() < self.scheme.problem.exit_depth.value();
        if lands {
            // Time and velocity at its end do not matter for the place.
            let here = self.scheme.state();
            let to = State { depth: x.value(), ..here };
            let step = Step { from: here, to, deceleration: self.scheme.node.d, size: h };
            return self.land(end, step.reach(end).unwrap_or(h));
        }
        // The old stage is answerable for the step that leaves it; the new one for the force at the node beyond.
        let first = self.scheme.stage;
        self.scheme.step_max = self.scheme.step_max.max(h.value());
        self.scheme.enter_stage_at(x.value());
        let next = self.scheme.arrive(x, u, h);
        self.scheme.finite("velocity", next.v)?;
        Ok(self.settle(next, first))
    }

    /// The next step, to the node `next`, comes to rest before any stage end or exit. Whether the flight ends in it.
    fn come_to_rest(&mut self, next: Node<S, A>) -> Result<bool, IntegrationError> {
        self.scheme.cost.force_evaluations += R::EVALUATIONS;
        let step = self.scheme.step_to(&next);
        let end = self.scheme.problem.stages[self.scheme.stage].end;
        if self.scheme.options.boundaries == Boundaries::Landed
            && end.value() < self.scheme.problem.exit_depth.value()
            && let Some(part) = step.reach(end)
        {
            // The step went past the end and came back.
            self.scheme.cost.rejected_steps += 1;
            return self.land(end, part);
        }
        let static_force = self.scheme.law.force(next.x.value(), S::zero()).value();
        if static_force == 0.0 && next.v.value() == 0.0 {
            let why = "the force dies out with the velocity";
            return Err(IntegrationError::NeverEnds { why, last: self.scheme.state().values() });
        }
        Ok(self.settle(next, self.scheme.stage))
    }

    /// Takes the step shortened to `part`, which lands on the stage end `end`, and starts afresh behind it.
    fn land(&mut self, end: S, part: S) -> Result<bool, IntegrationError> {
        let first = self.scheme.stage;
        self.scheme.step_max = self.scheme.step_max.max(part.value());
        let kick = S::from_f64(0.5) * (self.scheme.node.h + part) * self.scheme.node.d;
        let u = self.scheme.node.u.plus(-kick);
        let next = self.scheme.arrive(A::new(end), u, part);
        self.scheme.finite("velocity", next.v)?;
        if next.v.value() <= 0.0 {
            return Ok(self.settle(next, first));
        }
        self.scheme.cost.steps += 1;
        fault!("landed-whole-step", self.scheme.clock.tick_part(part), self.scheme.clock.tick());
        let landing = State { time: self.scheme.clock.now(), depth: end, velocity: next.v };
        self.scheme.enter_stage_at(end);
        for index in first..self.scheme.stage {
            self.push(EventKind::boundary(self.scheme.problem, index), landing, index);
        }
        fault!("landed-one-force", self.scheme.start(landing), self.scheme.node = next);
        Ok(false)
    }

    /// Completes the step to the node `next`, with the events that `boundaries` sees in it, from stage `first` on.
    /// Whether the flight ends in it.
    fn settle(&mut self, next: Node<S, A>, first: usize) -> bool {
        self.scheme.cost.steps += 1;
        let mut step = self.scheme.step_to(&next);
        self.scheme.clock.tick();
        step.to.time = self.scheme.clock.now();
        let ended = match self.scheme.options.boundaries {
            Boundaries::StepEnd => self.see_at_step_end(&step, first),
            Boundaries::Interpolated | Boundaries::Landed => self.locate(&step, first),
        };
        self.scheme.node = next;
        ended
    }

    fn see_at_step_end(&mut self, step: &Step<S>, first: usize) -> bool {
        let problem = self.scheme.problem;
        let (reached, at_rest) = (step.to.depth.value(), step.to.velocity.value() <= 0.0);
        let arrival = if at_rest { State { velocity: S::zero(), ..step.to } } else { step.to };
        for index in first..problem.stages.len() {
            let end = problem.stages[index].end.value();
            if end > reached || end > problem.exit_depth.value() {
                break;
            }
            self.push(EventKind::boundary(problem, index), arrival, index);
        }
        if reached >= problem.exit_depth.value() {
            return self.leave(arrival);
        }
        if at_rest {
            let turned_back = step.from.depth.value() > reached;
            let depth = if fault!("step-end-depth", turned_back, false) { step.from.depth } else { step.to.depth };
            self.push(EventKind::Rest, State { depth, ..arrival }, self.scheme.stage);
        }
        at_rest
    }

    fn locate(&mut self, step: &Step<S>, first: usize) -> bool {
        let problem = self.scheme.problem;
        let mut deepest = step.from.depth;
        for index in first..problem.stages.len() {
            let end = problem.stages[index].end;
            if end.value() > problem.exit_depth.value() {
                break;
            }
            let Some(tau) = step.reach(end) else { break };
            deepest = end;
            self.push(EventKind::boundary(problem, index), step.at(tau, end), index);
        }
        if problem.has_exit()
            && let Some(tau) = step.reach(problem.exit_depth)
        {
            return self.leave(step.at(tau, problem.exit_depth));
        }
        let Some(tau) = step.rest() else { return false };
        let depth = step.depth(tau);
        let depth = if depth.value() > deepest.value() { depth } else { deepest };
        let rest = State { time: step.from.time + tau, depth, velocity: S::zero() };
        self.push(EventKind::Rest, rest, self.scheme.stage);
        true
    }

    /// The exit is reached in `state`; a projectile without velocity rests there.
    fn leave(&mut self, state: State<S>) -> bool {
        self.push(EventKind::Exit, state, self.scheme.stage);
        if state.velocity.value() <= 0.0 {
            self.push(EventKind::Rest, state, self.scheme.stage);
        }
        true
    }

    fn push(&mut self, kind: EventKind, state: State<S>, stage: usize) {
        self.events.push(Event { kind, state });
        if self.detail == Detail::Trajectory {
            // An extra look for the table, not work of the scheme: it is not counted.
            let force = self.scheme.problem.stages[stage].force(state.depth, state.velocity).value();
            self.trajectory.push(Sample { state: state.values(), force, stage });
        }
    }

    fn record_node(&mut self) {
        if self.detail == Detail::Trajectory {
            let force = (self.scheme.node.d * self.scheme.problem.mass).value();
            let state = self.scheme.state().values();
            self.trajectory.push(Sample { state, force, stage: self.scheme.stage });
        }
    }

    /// Sums up a flight whose last event is its end.
    fn finish(mut self) -> Flight<S> {
        let problem = self.scheme.problem;
        self.scheme.leave_stage(self.scheme.stage);
        let perforated = self.events.iter().any(|event| event.kind == EventKind::Exit);
        let end = self.events.last().map_or_else(|| self.scheme.state(), |event| event.state);
        // A place at a stage end belongs to the stage that ends there.
        let place = if perforated { problem.exit_depth } else { end.depth };
        let stage = problem.stages.iter().take_while(|stage| stage.end.value() < place.value()).count();
        let outcome = if perforated { Outcome::Perforated } else { problem.stop_in(stage) };
        let events: Vec<Event> = self.events.iter().map(|e| Event { kind: e.kind, state: e.state.values() }).collect();
        let margin = exit_margin(&problem.cast(), outcome, stage, end.values(), &events);
        let mut notes = Vec::new();
        if self.detail == Detail::End {
            self.events.retain(|event| matches!(event.kind, EventKind::Exit | EventKind::Rest));
        } else {
            notes.push("error bar of the exit margin not given: a fixed step has no error estimate".to_owned());
        }
        Flight {
            outcome,
            stage,
            end,
            events: self.events,
            exit_margin: margin,
            exit_margin_error: None,
            cost: self.scheme.cost,
            trajectory: self.trajectory,
            step_limit: Some(self.scheme.step_limit),
            notes,
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on should stop")]
pub(crate) mod tests {
    use smallvec::smallvec;

    use super::*;
    use crate::physics::{Stages, Target};

    pub(crate) const VELOCITIES: [VelocityAt; 3] =
        [VelocityAt::LaggedHalfStep, VelocityAt::Centred, VelocityAt::PredictedHalfStep];
    pub(crate) const BOUNDARIES: [Boundaries; 3] = [Boundaries::StepEnd, Boundaries::Interpolated, Boundaries::Landed];

    /// Mass [kg], static strength P [N], drag Q [kg/m] and crater depth k d [m] of a 50 mm projectile in concrete
    /// of 36 N/mm², at V0 [m/s].
    pub(crate) const MASS: f64 = 2.0;
    pub(crate) const STRENGTH: f64 = 848_230.0;
    pub(crate) const DRAG: f64 = 3.2515;
    pub(crate) const CRATER_DEPTH: f64 = 0.1;
    pub(crate) const SPEED: f64 = 300.0;

    fn stage(p: f64, s: f64, r: f64, q: f64, end: f64) -> Stage {
        Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end }
    }

    pub(crate) fn stages(list: Stages, speed: f64, exit_depth: f64) -> Problem {
        Problem { mass: MASS, impact_speed: speed, exit_depth, stages: list, crater: None, target: Target::Stages }
    }

    /// Crater and tunnel with drag `q`; the crater constant times `jump` of the continuous one.
    pub(crate) fn concrete(q: f64, jump: f64, speed: f64, exit_depth: f64) -> Problem {
        let stiffness = jump * MASS * (STRENGTH + q * speed * speed) / (CRATER_DEPTH * (MASS + CRATER_DEPTH * q));
        Problem {
            crater: Some(0),
            target: Target::CraterAndTunnel,
            ..stages(smallvec![Stage::crater(stiffness, CRATER_DEPTH), Stage::tunnel(STRENGTH, q)], speed, exit_depth)
        }
    }

    pub(crate) fn scheme(step: f64, velocity: VelocityAt, boundaries: Boundaries) -> CentralDifference {
        CentralDifference::uniform(step, velocity, boundaries)
    }

    /// Exact depth, time and velocity at the end, time and velocity at k d (theory section 2); `concrete` scenes only.
    pub(crate) struct Exact {
        pub(crate) depth: f64,
        pub(crate) time: f64,
        pub(crate) velocity: f64,
        pub(crate) crater_end_time: f64,
        pub(crate) crater_end_velocity: f64,
    }

    impl Exact {
        pub(crate) fn of(problem: &Problem) -> Self {
            let (v0, kd) = (problem.impact_speed, problem.stages[0].end);
            let w = (problem.stages[0].stiffness / MASS).sqrt();
            let nan = f64::NAN;
            if v0 / w <= kd {
                let time = std::f64::consts::FRAC_PI_2 / w;
                return Self { depth: v0 / w, time, velocity: 0.0, crater_end_time: nan, crater_end_velocity: nan };
            }
            let (p, q) = (problem.stages[1].static_force, problem.stages[1].drag);
            let v1 = ((v0 - w * kd) * (v0 + w * kd)).sqrt();
            let t1 = (w * kd).atan2(v1) / w;
            let u = q * v1 * v1 / p;
            let rest = kd + MASS * v1 * v1 / (2.0 * p) * if u == 0.0 { 1.0 } else { u.ln_1p() / u };
            let depth = rest.min(problem.exit_depth);
            let xi = depth - kd;
            let y = 2.0 * q * xi / MASS;
            let e = if y == 0.0 { 1.0 } else { (-y).exp_m1() / -y };
            let w_end = v1 * v1 * (-y).exp() - 2.0 * p * xi / MASS * e;
            let velocity = if rest < problem.exit_depth { 0.0 } else { w_end.sqrt() };
            let (a, b) = (v1 * (q / p).sqrt(), velocity * (q / p).sqrt());
            let z = (a - b) / (1.0 + a * b);
            let time = t1 + MASS / p * (v1 - velocity) / (1.0 + a * b) * if z == 0.0 { 1.0 } else { z.atan() / z };
            Self { depth, time, velocity, crater_end_time: t1, crater_end_velocity: v1 }
        }
    }

    /// `count` fractions spread evenly and without a common ratio: multiples of the golden section, modulo 1.
    pub(crate) fn spread(count: u32) -> impl Iterator<Item = f64> {
        (1..=count).map(|i| (f64::from(i) * 0.618_033_988_749_894_8).fract())
    }

    /// Slope of the points by least squares, and half of its 95 % interval.
    pub(crate) fn slope(points: &[(f64, f64)]) -> (f64, f64) {
        let n = points.len() as f64;
        let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
        let xx: f64 = points.iter().map(|(x, _)| (x - mx).powi(2)).sum();
        let xy: f64 = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
        let slope = xy / xx;
        let rest: f64 = points.iter().map(|(x, y)| (y - my - slope * (x - mx)).powi(2)).sum();
        (slope, 2.0 * (rest / (n - 2.0) / xx).sqrt())
    }

    /// `V_r² = (V0 - w H)(V0 + w H)`, `t = atan2(w H, V_r)/w`.
    pub(crate) fn exit_in_crater(problem: &Problem) -> Exact {
        let w = (problem.stages[0].stiffness / MASS).sqrt();
        let (v0, h) = (problem.impact_speed, problem.exit_depth);
        let velocity = ((v0 - w * h) * (v0 + w * h)).sqrt();
        let time = (w * h).atan2(velocity) / w;
        Exact { depth: h, time, velocity, crater_end_time: f64::NAN, crater_end_velocity: f64::NAN }
    }

    /// Every combination of the rules.
    fn combinations() -> impl Iterator<Item = (VelocityAt, Boundaries)> {
        VELOCITIES.into_iter().flat_map(|velocity| BOUNDARIES.into_iter().map(move |boundaries| (velocity, boundaries)))
    }

    /// A crater without end, with w = `w` [1/s].
    fn spring(w: f64) -> Problem {
        stages(smallvec![stage(0.0, MASS * w * w, 0.0, 0.0, f64::INFINITY)], SPEED, f64::INFINITY)
    }

    #[test]
    fn nodes_in_the_crater_are_the_exact_discrete_solution_for_every_velocity_rule() {
        // x(i) = V0 dt sin(i th)/sin(th), 2 sin(th/2) = w dt, over many swings: no event is looked for.
        let w = 2300.0;
        for velocity in VELOCITIES {
            for (w_dt, limit) in [(1e-3, 1e-12), (0.1, 1e-12), (0.37, 1e-12), (1.0, 1e-12), (1.999_999, 4e-10)] {
                let step = w_dt / w;
                let states = scheme(step, velocity, Boundaries::StepEnd).free_states(&spring(w), 4001).unwrap();
                let theta = 2.0 * f64::asin(0.5 * w * step);
                let amplitude = SPEED * step / theta.sin();
                for (i, state) in states.iter().enumerate() {
                    let error = (state.depth - amplitude * (i as f64 * theta).sin()).abs() / amplitude;
                    assert!(error <= limit, "{velocity}, w dt = {w_dt}: {error:e} at step {i}");
                    assert_eq!(state.time, i as f64 * step, "the time of a step is i dt to the bit");
                }
            }
        }
    }

    #[test]
    fn amplitudes_grow_linearly_at_the_limit_and_geometrically_beyond() {
        let w = 1024.0;
        let at = |w_dt: f64| {
            scheme(w_dt / w, VelocityAt::LaggedHalfStep, Boundaries::StepEnd).free_states(&spring(w), 1001).unwrap()
        };
        for (i, state) in at(2.0).iter().enumerate() {
            let expected = SPEED * 2.0 / w * i as f64;
            assert!((state.depth.abs() - expected).abs() <= 1e-12 * expected, "step {i}: {}", state.depth);
        }
        let w_dt: f64 = 2.02;
        let half_trace = 1.0 - 0.5 * w_dt * w_dt;
        let growth = -half_trace + (half_trace * half_trace - 1.0).sqrt();
        let states = at(w_dt);
        let measured = (states[1000].depth / states[999].depth).abs();
        assert!((measured / growth - 1.0).abs() < 1e-10, "measured {measured}, theory {growth}");
        assert!(at(1.99).iter().all(|state| state.depth.abs() < SPEED / w * 11.0));
    }

    #[test]
    fn the_stability_limit_separates_decay_from_growth() {
        // A linear spring and dashpot: the limit is sharp, combined too. Ratios g/w on both sides of the value (0.44)
        // below which the predicted rule is limited by the spring.
        for velocity in VELOCITIES {
            for ratio in [0.02, 0.2, 0.43, 0.45, 1.0, 5.0] {
                let w = 100.0;
                let law = stage(0.0, MASS * w * w, MASS * w * ratio, 0.0, f64::INFINITY);
                let problem = stages(smallvec![law], SPEED, f64::INFINITY);
                let limit = stability_limit(&law, MASS, SPEED, velocity);
                let last = |part: f64| {
                    let scheme = scheme(part * limit, velocity, Boundaries::StepEnd);
                    scheme.free_states(&problem, 20_001).unwrap()[20_000].depth.abs()
                };
                let start = SPEED / w;
                assert!(last(0.995) < 1e-3 * start, "{velocity}, g/w = {ratio}: {}", last(0.995));
                let beyond = last(1.005);
                assert!(beyond.is_nan() || beyond > 1e3 * start, "{velocity}, g/w = {ratio}: {beyond}");
            }
        }
        let tunnel = Stage::tunnel(STRENGTH, DRAG);
        let lagged = stability_limit(&tunnel, MASS, SPEED, VelocityAt::LaggedHalfStep);
        approx::assert_relative_eq!(lagged, MASS / (DRAG * SPEED), max_relative = 1e-15);
        for velocity in VELOCITIES {
            assert_eq!(stability_limit(&Stage::tunnel(STRENGTH, 0.0), MASS, SPEED, velocity), f64::INFINITY);
            approx::assert_relative_eq!(stability_limit(&Stage::crater(8.0, 1.0), 2.0, SPEED, velocity), 1.0);
        }
    }

    #[test]
    fn a_constant_force_gives_the_exact_parabola_at_equal_and_unequal_steps() {
        let problem = stages(smallvec![Stage::tunnel(STRENGTH, 0.0)], SPEED, f64::INFINITY);
        let rest = MASS * SPEED / STRENGTH;
        let uneven: Vec<f64> = spread(37).map(|u| (0.1 + u) * 1e-5).collect();
        for steps in [Steps::Uniform(7.3e-6), Steps::Given(vec![1e-5, 2.5e-6]), Steps::Given(uneven)] {
            for (velocity, boundaries) in combinations() {
                let scheme = CentralDifference { steps: steps.clone(), ..scheme(1.0, velocity, boundaries) };
                let flight = scheme.fly(&problem, Detail::Trajectory).unwrap();
                for row in flight.trajectory.iter().filter(|row| row.state.velocity > 0.0) {
                    let t = row.state.time;
                    let depth = t * (SPEED - 0.5 * t * STRENGTH / MASS);
                    assert!((row.state.depth - depth).abs() < 1e-15 * 100.0, "{steps:?} {velocity} {boundaries}");
                }
                if boundaries != Boundaries::StepEnd {
                    approx::assert_relative_eq!(flight.end.time, rest, max_relative = 1e-13);
                    approx::assert_relative_eq!(flight.end.depth, 0.5 * rest * SPEED, max_relative = 1e-13);
                }
            }
        }
    }

    #[test]
    fn the_path_without_drag_is_a_parabola_from_its_first_node_in_the_tunnel() {
        let problem = concrete(0.0, 1.0, SPEED, f64::INFINITY);
        for steps in [Steps::Uniform(3.1e-6), Steps::Given(vec![5e-6, 1e-6, 2e-6])] {
            for (velocity, boundaries) in combinations() {
                let scheme = CentralDifference { steps: steps.clone(), ..scheme(1.0, velocity, boundaries) };
                let flight = scheme.fly(&problem, Detail::Trajectory).unwrap();
                // The node where the tunnel's force is first at work, and none of the events.
                let tunnel: Vec<&Sample> =
                    flight.trajectory.iter().filter(|row| row.stage == 1 && row.state.velocity > 0.0).collect();
                let first = tunnel[0].state;
                for row in &tunnel {
                    let t = row.state.time - first.time;
                    let depth = first.depth + t * (first.velocity - 0.5 * t * STRENGTH / MASS);
                    assert!((row.state.depth / depth - 1.0).abs() < 2e-13, "{velocity} {boundaries} {:?}", row.state);
                }
            }
        }
    }

    #[test]
    fn rest_in_the_crater_misses_by_the_constants_of_the_discrete_solution() {
        // X(dt)/X - 1 -> (w dt)²/8, T(dt)/T - 1 -> -(w dt)²/24.
        let problem = concrete(DRAG, 1.0, 100.0, f64::INFINITY);
        let exact = Exact::of(&problem);
        let w = (problem.stages[0].stiffness / MASS).sqrt();
        for u in spread(20) {
            // Located inside a step, the time has a further term of order (w dt)³.
            let step = (0.000_5 + 0.002_5 * u) / w;
            let square = (w * step).powi(2);
            for (velocity, boundaries) in combinations() {
                let flight = scheme(step, velocity, boundaries).fly(&problem, Detail::End).unwrap();
                assert_eq!(flight.outcome, Outcome::StoppedInCrater);
                let depth = (flight.end.depth / exact.depth - 1.0) / square;
                let time = (flight.end.time / exact.time - 1.0) / square;
                if boundaries == Boundaries::StepEnd {
                    assert!((-1e-3..0.125 + 1e-3).contains(&depth), "{depth}");
                } else {
                    assert!((depth * 8.0 - 1.0).abs() < 1e-3, "{velocity} {boundaries} {}", depth * 8.0);
                    assert!((time * -24.0 - 1.0).abs() < 1e-3, "{velocity} {boundaries} {}", time * -24.0);
                }
            }
        }
    }

    #[test]
    fn lagged_drag_has_the_error_constants_of_its_modified_equation() {
        // M V' = -F (1 + Q V dt/M) to first order in dt; D is the velocity lost to drag.
        for (jump, exit_depth) in [(1.0, f64::INFINITY), (1.0, 0.13), (0.6, f64::INFINITY), (0.6, 0.13)] {
            let problem = concrete(DRAG, jump, SPEED, exit_depth);
            let exact = Exact::of(&problem);
            let lost =
                exact.crater_end_velocity - exact.velocity - STRENGTH * (exact.time - exact.crater_end_time) / MASS;
            let way = exact.depth - CRATER_DEPTH;
            for boundaries in [Boundaries::Interpolated, Boundaries::Landed] {
                if jump != 1.0 && boundaries != Boundaries::Landed {
                    continue;
                }
                for steps in [2.03e4, 4.71e4] {
                    let step = exact.time / steps;
                    let flight =
                        scheme(step, VelocityAt::LaggedHalfStep, boundaries).fly(&problem, Detail::End).unwrap();
                    let time = (flight.end.time - exact.time) / step;
                    let (measured, constant) = if exit_depth.is_finite() {
                        let v = exact.velocity;
                        let force = STRENGTH + DRAG * v * v;
                        let expected = lost / v - DRAG * way / MASS;
                        assert!((time / expected - 1.0).abs() < 1e-3, "{boundaries}, t: {time} for {expected}");
                        ((flight.end.velocity - v) / step, -force * lost / (MASS * v))
                    } else {
                        let expected = -DRAG * way / MASS;
                        assert!((time / expected - 1.0).abs() < 1e-3, "{boundaries}, T: {time} for {expected}");
                        ((flight.end.depth - exact.depth) / step, -lost)
                    };
                    assert!((measured / constant - 1.0).abs() < 1e-3, "{boundaries}: {measured} for {constant}");
                }
            }
        }
    }

    /// Sizes of the steps along a flight relative to their mean, given about the inverse of their number.
    type Pattern = fn(f64) -> Vec<f64>;

    #[test]
    fn unequal_steps_keep_the_order() {
        let problem = concrete(DRAG, 0.6, SPEED, f64::INFINITY);
        let exact = Exact::of(&problem);
        let alternating: Pattern = |_| vec![1.0, 0.35];
        let smooth: Pattern =
            |scale| (0..(1.0 / scale) as u32).map(|i| 1.0 + 0.6 * (9.0 * scale * f64::from(i)).sin()).collect();
        let random: Pattern = |_| spread(1000).map(|u| 0.3 + u).collect();
        for (name, pattern) in [("alternating", alternating), ("smooth", smooth), ("random", random)] {
            for (velocity, formal) in VELOCITIES.into_iter().zip([1.0, 2.0, 2.0]) {
                let points: Vec<(f64, f64)> = spread(40)
                    .map(|u| {
                        let scale = 10.0_f64.powf(-4.5 + 2.0 * u);
                        let sizes = pattern(scale).iter().map(|part| part * scale * exact.time).collect();
                        let scheme = CentralDifference {
                            steps: Steps::Given(sizes),
                            ..scheme(1.0, velocity, Boundaries::Landed)
                        };
                        let flight = scheme.fly(&problem, Detail::End).unwrap();
                        (scale.ln(), (flight.end.depth / exact.depth - 1.0).abs().ln())
                    })
                    .collect();
                let (order, half_width) = slope(&points);
                println!("{name:12} {velocity:9} depth {order:.2}+-{half_width:.2}");
                assert!((order - formal).abs() < 0.1, "{name}, {velocity}: {order:.3} +- {half_width:.3}");
            }
        }
    }

    #[test]
    fn a_given_sequence_of_equal_steps_is_the_uniform_scheme() {
        let problem = concrete(DRAG, 0.6, SPEED, 0.13);
        for (velocity, boundaries) in combinations() {
            let uniform = scheme(3.3e-6, velocity, boundaries).fly(&problem, Detail::Events).unwrap();
            let given = CentralDifference { steps: Steps::Given(vec![3.3e-6; 3]), ..scheme(1.0, velocity, boundaries) };
            let given = given.fly(&problem, Detail::Events).unwrap();
            assert_eq!(uniform.end.depth, given.end.depth);
            assert_eq!(uniform.end.velocity, given.end.velocity);
            assert_eq!(uniform.cost, given.cost);
            approx::assert_relative_eq!(uniform.end.time, given.end.time, max_relative = 1e-15);
        }
    }

    #[test]
    fn a_landing_is_equation_6_with_the_force_of_its_own_side_in_each_half_step() {
        let problem = concrete(DRAG, 0.6, SPEED, f64::INFINITY);
        let step = 3.7e-6;
        let flight = scheme(step, VelocityAt::Centred, Boundaries::Landed).fly(&problem, Detail::Trajectory).unwrap();
        let rows = &flight.trajectory;
        let landed = rows.iter().position(|row| row.state.depth == CRATER_DEPTH).unwrap();
        // Rows: ..., node before, event at k d (crater's force), node at k d (tunnel's force), node behind.
        let (before, event, node, behind) = (rows[landed - 1], rows[landed], rows[landed + 1], rows[landed + 2]);
        assert_eq!((event.stage, node.stage), (0, 1));
        assert_eq!(event.state, node.state);
        let short = node.state.time - before.state.time;
        assert!(short > 0.0 && short < step, "{short}");
        approx::assert_relative_eq!(behind.state.time - node.state.time, step, max_relative = 1e-9);
        let into = (node.state.depth - before.state.depth) / short;
        let out = (behind.state.depth - node.state.depth) / step;
        let kick = 0.5 * (short * event.force + step * node.force) / MASS;
        approx::assert_relative_eq!(out, into - kick, max_relative = 1e-9);
        // And the place: x is met by the step as it was shortened, not put there afterwards.
        let lands = before.state.depth + short * (before.state.velocity - 0.5 * short * before.force / MASS);
        approx::assert_relative_eq!(lands, CRATER_DEPTH, max_relative = 1e-15);
    }

    #[test]
    fn work_is_counted_exactly() {
        let ends = [0.02, 0.05, 0.050_000_1, 0.08];
        let mut list: Stages = ends.iter().map(|end| stage(STRENGTH, 0.0, 0.0, DRAG, *end)).collect();
        list.push(Stage::tunnel(STRENGTH, DRAG));
        for problem in [stages(list.clone(), SPEED, f64::INFINITY), stages(list, SPEED, 0.09)] {
            for (velocity, boundaries) in combinations() {
                for step in [1e-7, 3.3e-6, 1e-4] {
                    let scheme = scheme(step, velocity, boundaries);
                    let flight = scheme.fly(&problem, Detail::Trajectory).unwrap();
                    let each = if velocity == VelocityAt::PredictedHalfStep { 2 } else { 1 };
                    let stage_ends =
                        flight.events.iter().filter(|event| matches!(event.kind, EventKind::StageEnd(_))).count();
                    let landings = if boundaries == Boundaries::Landed { stage_ends as u64 } else { 0 };
                    let cost = flight.cost;
                    let expected = 1 + landings + each * (cost.steps + cost.rejected_steps);
                    assert_eq!(cost.force_evaluations, expected, "{velocity} {boundaries} {step}");
                    assert_eq!(flight.trajectory.len() as u64, cost.steps + flight.events.len() as u64);
                    // What is asked for changes what is told, not what is flown.
                    let brief = scheme.fly(&problem, Detail::End).unwrap();
                    assert_eq!((brief.end, brief.cost), (flight.end, flight.cost));
                    assert_eq!(brief.exit_margin, flight.exit_margin);
                    assert!(brief.trajectory.is_empty() && brief.events.len() <= 2);
                }
            }
        }
        let flight = scheme(1e-6, VelocityAt::Centred, Boundaries::StepEnd)
            .fly(&stages(smallvec![Stage::tunnel(1e5, 0.0)], 1.0, f64::INFINITY), Detail::End)
            .unwrap();
        assert_eq!((flight.cost.steps, flight.cost.force_evaluations), (20, 21));
    }

    fn kinds(flight: &Flight) -> Vec<EventKind> {
        flight.events.iter().map(|event| event.kind).collect()
    }

    #[test]
    fn ten_stage_ends_in_one_step_and_equal_ones_are_listed_in_order() {
        let ends = [0.010, 0.011, 0.012, 0.012, 0.012, 0.013, 0.014, 0.015, 0.016, 0.017];
        let mut list: Stages =
            ends.iter().enumerate().map(|(i, end)| stage(1e4 * (i + 1) as f64, 0.0, 0.0, 0.1, *end)).collect();
        list.push(Stage::tunnel(STRENGTH, DRAG));
        let problem = stages(list, SPEED, 0.05);
        for (velocity, boundaries) in combinations() {
            let flight = scheme(3e-5, velocity, boundaries).fly(&problem, Detail::Events).unwrap();
            let expected: Vec<EventKind> = (0..10).map(EventKind::StageEnd).chain([EventKind::Exit]).collect();
            assert_eq!(kinds(&flight), expected, "{velocity} {boundaries}");
            assert!(flight.events.windows(2).all(|pair| pair[0].state.time <= pair[1].state.time));
            for (event, end) in flight.events.iter().zip(ends) {
                if boundaries == Boundaries::StepEnd {
                    assert!(event.state.depth >= end);
                } else {
                    assert_eq!(event.state.depth, end);
                }
            }
            let mut times: Vec<f64> = flight.events[..10].iter().map(|event| event.state.time).collect();
            times.dedup();
            assert_eq!(times.len(), if boundaries == Boundaries::StepEnd { 1 } else { 8 });
        }
    }

    #[test]
    fn stage_ends_at_the_face_are_reached_at_impact() {
        let list: Stages =
            smallvec![stage(1.0, 0.0, 0.0, 0.0, 0.0), stage(1.0, 0.0, 0.0, 0.0, 0.0), Stage::tunnel(STRENGTH, DRAG)];
        let problem = stages(list, SPEED, f64::INFINITY);
        for (velocity, boundaries) in combinations() {
            let flight = scheme(1e-6, velocity, boundaries).fly(&problem, Detail::Events).unwrap();
            assert_eq!(kinds(&flight), [EventKind::StageEnd(0), EventKind::StageEnd(1), EventKind::Rest]);
            assert_eq!(flight.events[1].state, State::at_impact(&problem));
            assert_eq!(flight.stage, 2);
        }
    }

    /// M = 2, P = 64, V0 = 8: rest at x = 1, t = 1/4, and every node is exact for steps of 1/64.
    fn binary(list: Stages, exit_depth: f64) -> Problem {
        Problem { crater: Some(0), target: Target::CraterAndTunnel, ..stages(list, 8.0, exit_depth) }
    }

    #[test]
    fn crater_end_exit_and_rest_at_one_node_come_in_this_order_and_perforate() {
        let list: Stages = smallvec![stage(64.0, 0.0, 0.0, 0.0, 1.0), Stage::tunnel(64.0, 0.0)];
        for (velocity, boundaries) in combinations() {
            let scheme = scheme(1.0 / 64.0, velocity, boundaries);
            let flight = scheme.fly(&binary(list.clone(), 1.0), Detail::Events).unwrap();
            assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Exit, EventKind::Rest]);
            assert_eq!(flight.outcome, Outcome::Perforated);
            assert_eq!(flight.end, State { time: 0.25, depth: 1.0, velocity: 0.0 });
            assert_eq!((flight.stage, flight.exit_margin), (0, Some(0.0)));
            // A little more target, and it stops on the crater's end, which still is the crater.
            let flight = scheme.fly(&binary(list.clone(), 1.0 + f64::EPSILON), Detail::Events).unwrap();
            assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Rest]);
            assert_eq!((flight.outcome, flight.stage), (Outcome::StoppedInCrater, 0));
            assert!(flight.exit_margin.unwrap() < 0.0);
            // A little less, and it leaves.
            let flight = scheme.fly(&binary(list.clone(), 1.0 - f64::EPSILON), Detail::Events).unwrap();
            assert_eq!(kinds(&flight)[0], EventKind::Exit, "the crater's end lies behind the target");
            assert_eq!(flight.outcome, Outcome::Perforated);
        }
        // With a step that does not meet the place, located: still all three, at the same place.
        for velocity in VELOCITIES {
            for boundaries in [Boundaries::Interpolated, Boundaries::Landed] {
                let flight =
                    scheme(3.0 / 64.0, velocity, boundaries).fly(&binary(list.clone(), 1.0), Detail::Events).unwrap();
                assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Exit, EventKind::Rest]);
            }
        }
    }

    #[test]
    fn a_place_or_rest_exactly_at_a_node_belongs_to_that_step() {
        let step = 1.0 / 64.0;
        for (velocity, boundaries) in combinations() {
            let scheme = scheme(step, velocity, boundaries);
            let alone = binary(smallvec![Stage::tunnel(64.0, 0.0)], f64::INFINITY);
            let rest = scheme.fly(&Problem { crater: None, ..alone.clone() }, Detail::Events).unwrap();
            assert_eq!((rest.end, rest.cost.steps), (State { time: 0.25, depth: 1.0, velocity: 0.0 }, 16));
            let exit = scheme.fly(&Problem { crater: None, exit_depth: 0.75, ..alone }, Detail::Events).unwrap();
            assert_eq!((exit.end, exit.cost.steps), (State { time: 0.125, depth: 0.75, velocity: 4.0 }, 8));
            assert_eq!(kinds(&exit), [EventKind::Exit]);
            // The force of the far side holds from the node that stands on the end.
            let jump = smallvec![stage(64.0, 0.0, 0.0, 0.0, 0.75), Stage::tunnel(128.0, 0.0)];
            let flight = scheme.fly(&binary(jump, f64::INFINITY), Detail::Trajectory).unwrap();
            let node = flight.trajectory.iter().rfind(|row| row.state.depth == 0.75).unwrap();
            assert_eq!((node.state.time, node.stage, node.force), (0.125, 1, 128.0));
        }
    }

    #[test]
    fn a_stage_end_touched_on_the_way_back_to_rest_is_reached() {
        // Whole steps see x(6) = 0.984 and V < 0; the vertex in between stands at 1.
        let list: Stages = smallvec![stage(64.0, 0.0, 0.0, 0.0, 0.999), Stage::tunnel(64.0, 0.0)];
        for velocity in VELOCITIES {
            for boundaries in [Boundaries::Interpolated, Boundaries::Landed] {
                let scheme = scheme(3.0 / 64.0, velocity, boundaries);
                let flight = scheme.fly(&binary(list.clone(), f64::INFINITY), Detail::Events).unwrap();
                assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Rest]);
                assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
                approx::assert_relative_eq!(flight.end.depth, 1.0, max_relative = 1e-15);
                assert_eq!(flight.cost.rejected_steps, u64::from(boundaries == Boundaries::Landed));
                let flight = scheme.fly(&binary(list.clone(), 0.999), Detail::Events).unwrap();
                assert_eq!(flight.outcome, Outcome::Perforated);
            }
        }
    }

    #[test]
    fn rest_is_never_told_above_a_place_already_reached() {
        // A coarse step through a viscous stage: the parabola has its vertex at x = 0.11, V on the chord falls to zero
        // later, where the parabola is back at 0.06.
        let viscous = |end| stage(64.0, 0.0, 64.0, 0.0, end);
        let problem = stages(smallvec![viscous(0.1), viscous(f64::INFINITY)], 8.0, f64::INFINITY);
        let flight = scheme(0.05, VelocityAt::LaggedHalfStep, Boundaries::Interpolated).fly(&problem, Detail::Events);
        let flight = flight.unwrap();
        assert_eq!(kinds(&flight), [EventKind::StageEnd(0), EventKind::Rest]);
        assert_eq!(flight.end.depth, 0.1);
    }

    #[test]
    fn landing_at_rest_on_a_jump_asks_only_the_near_side() {
        for tunnel in [1.0, 64.0, 1e6] {
            let problem = binary(smallvec![stage(64.0, 0.0, 0.0, 0.0, 1.0), Stage::tunnel(tunnel, 0.0)], f64::INFINITY);
            for velocity in VELOCITIES {
                let flight = scheme(1.0 / 64.0, velocity, Boundaries::Landed).fly(&problem, Detail::Events).unwrap();
                assert_eq!(kinds(&flight), [EventKind::CraterEnd, EventKind::Rest]);
                assert_eq!(flight.outcome, Outcome::StoppedInCrater);
            }
        }
    }

    #[test]
    fn a_step_far_beyond_rest_still_ends_the_flight() {
        // dt F/M exceeds V by up to 1e9: past rest P + Q V² keeps its sign, and a later test would see V run away.
        let cases = [
            concrete(DRAG, 1.0, SPEED, f64::INFINITY),
            concrete(DRAG, 1.0, SPEED, 0.2),
            stages(smallvec![Stage::tunnel(STRENGTH, DRAG)], SPEED, f64::INFINITY),
            stages(smallvec![Stage::tunnel(STRENGTH, DRAG)], SPEED, 1.0),
            stages(smallvec![Stage::tunnel(STRENGTH, 1e3)], SPEED, 1.0),
        ];
        for problem in &cases {
            for (velocity, boundaries) in combinations() {
                for step in [1e-3, 1e-2, 1.0, 1e6] {
                    let flight = scheme(step, velocity, boundaries).fly(problem, Detail::Events).unwrap();
                    assert!(flight.cost.steps < 10, "{velocity} {boundaries} {step}: {:?}", flight.cost);
                    let last = flight.events.last().unwrap();
                    assert_eq!(flight.end, last.state);
                    assert!(flight.end.velocity >= 0.0 && flight.end.depth >= 0.0);
                    assert_eq!(
                        flight.outcome == Outcome::Perforated,
                        flight.events.iter().any(|e| e.kind == EventKind::Exit)
                    );
                    assert!(flight.events.windows(2).all(|pair| {
                        pair[0].state.time <= pair[1].state.time && pair[0].state.depth <= pair[1].state.depth
                    }));
                    let crater = problem.stages[0].stiffness > 0.0;
                    if crater || velocity == VelocityAt::LaggedHalfStep && step >= 1.0 {
                        assert!(!flight.step_limit.unwrap().stable || boundaries == Boundaries::Landed);
                    }
                }
            }
        }
    }

    #[test]
    fn step_end_shows_whole_steps_and_the_largest_depth() {
        let step = 7e-6;
        for velocity in VELOCITIES {
            let scheme = scheme(step, velocity, Boundaries::StepEnd);
            for problem in [concrete(DRAG, 1.0, SPEED, 0.13), concrete(DRAG, 1.0, SPEED, f64::INFINITY)] {
                let flight = scheme.fly(&problem, Detail::Trajectory).unwrap();
                for event in &flight.events {
                    let steps = (event.state.time / step).round();
                    assert_eq!(event.state.time, steps * step);
                }
                let deepest = flight.trajectory.iter().map(|row| row.state.depth).fold(0.0, f64::max);
                assert_eq!(flight.end.depth, deepest);
                if problem.has_exit() {
                    assert!(
                        flight.end.depth > 0.13 && flight.trajectory.iter().rev().nth(1).unwrap().state.depth <= 0.13
                    );
                }
            }
        }
    }

    #[test]
    fn the_step_limit_is_that_of_the_stages_flown() {
        let problem = concrete(DRAG, 1.0, SPEED, f64::INFINITY);
        let w = (problem.stages[0].stiffness / MASS).sqrt();
        let flown = |step: f64, velocity, speed: f64| {
            let problem = Problem { impact_speed: speed, ..problem.clone() };
            scheme(step, velocity, Boundaries::Landed).fly(&problem, Detail::End).unwrap().step_limit.unwrap()
        };
        let limit = flown(1e-6, VelocityAt::Centred, SPEED);
        approx::assert_relative_eq!(limit.limit, 2.0 / w, max_relative = 1e-14);
        assert!(limit.stable);
        // Drag in the tunnel counts for the lagged rule, at the speed with which the tunnel begins.
        let drag = 500.0;
        let tunnel = stages(smallvec![Stage::tunnel(STRENGTH, drag)], SPEED, 0.01);
        let lagged =
            |step| scheme(step, VelocityAt::LaggedHalfStep, Boundaries::StepEnd).fly(&tunnel, Detail::End).unwrap();
        approx::assert_relative_eq!(
            lagged(1e-6).step_limit.unwrap().limit,
            MASS / (drag * SPEED),
            max_relative = 1e-14
        );
        assert!(lagged(1.3e-5).step_limit.unwrap().stable);
        assert!(!lagged(1.4e-5).step_limit.unwrap().stable);
        // Each stage is judged by its own speeds and steps.
        let drag = 100.0;
        let slowed = stages(
            smallvec![stage(4e5, 0.0, 0.0, 0.0, 0.2), stage(4e5, 1e9, 0.0, drag, f64::INFINITY)],
            SPEED,
            f64::INFINITY,
        );
        let scheme = CentralDifference {
            steps: Steps::Given([vec![5e-4], vec![2e-6; 10_000]].concat()),
            ..scheme(1.0, VelocityAt::LaggedHalfStep, Boundaries::Landed)
        };
        let flight = scheme.fly(&slowed, Detail::Events).unwrap();
        let behind = flight.events[0].state.velocity;
        assert!(flight.events[0].state.time > 5e-4 && behind < 0.7 * SPEED);
        let expected = stability_limit(&slowed.stages[1], MASS, behind, VelocityAt::LaggedHalfStep);
        let told = flight.step_limit.unwrap();
        approx::assert_relative_eq!(told.limit, expected, max_relative = 1e-14);
        assert!(told.stable);
        // A crater that a landed step crosses at once is flown with that short step.
        assert!(flown(1.0, VelocityAt::Centred, 300.0 * SPEED).stable);
    }

    #[test]
    fn the_default_step_is_stable_affordable_and_told() {
        let thin = |k: f64| {
            let mut problem = concrete(DRAG, 1.0, SPEED, f64::INFINITY);
            let depth = CRATER_DEPTH * k;
            problem.stages[0] =
                Stage::crater(MASS * (STRENGTH + DRAG * SPEED * SPEED) / (depth * (MASS + depth * DRAG)), depth);
            problem
        };
        for problem in [
            concrete(DRAG, 1.0, SPEED, f64::INFINITY),
            concrete(0.0, 1.0, 1e-3, f64::INFINITY),
            concrete(DRAG, 0.6, SPEED, 0.13),
            concrete(1e3, 1.0, 1e4, f64::INFINITY),
            thin(1e-2),
            thin(1e-8),
            stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, f64::INFINITY)], SPEED, 1.0),
        ] {
            for velocity in VELOCITIES {
                let scheme = CentralDifference { velocity, ..CentralDifference::default() };
                let step = scheme.time_step(&problem);
                let flight = scheme.fly(&problem, Detail::End).unwrap();
                assert!(flight.step_limit.unwrap().stable, "{step}: {:?}", flight.step_limit);
                assert!((100..20_000_000).contains(&flight.cost.steps), "{step}: {:?}", flight.cost);
                approx::assert_relative_eq!(flight.end.time, flight.cost.steps as f64 * step, max_relative = 1e-15);
            }
        }
        // Thinner still, the stability limit wins over the number of steps.
        let thinnest = thin(1e-14);
        let step = CentralDifference::default().time_step(&thinnest);
        let limit = stability_limit(&thinnest.stages[0], MASS, SPEED, VelocityAt::LaggedHalfStep);
        assert_eq!(step, PART_OF_LIMIT * limit);
        let nothing = stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, f64::INFINITY)], 0.0, 0.0);
        assert_eq!(CentralDifference::default().fly(&nothing, Detail::End).unwrap().outcome, Outcome::Perforated);
    }

    #[test]
    fn a_flight_without_an_end_is_refused_before_it_costs_anything() {
        for last in [stage(0.0, 0.0, 1.0, 1.0, f64::INFINITY), stage(-5.0, 0.0, 1.0, 1.0, f64::INFINITY)] {
            let problem = stages(smallvec![stage(1e3, 0.0, 0.0, 0.0, 0.1), last], SPEED, f64::INFINITY);
            for (velocity, boundaries) in combinations() {
                let error = scheme(1e-6, velocity, boundaries).fly(&problem, Detail::Events).unwrap_err();
                let IntegrationError::NeverEnds { last, .. } = error else { unreachable!("{error}") };
                assert!((last.depth - 0.1).abs() < 1e-3);
            }
        }
        // With a far side the same is a flight, and a stop before the endless stage is a stop.
        let barrier = stages(
            smallvec![stage(1e9, 0.0, 0.0, 0.0, 0.1), stage(0.0, 0.0, 1.0, 1.0, f64::INFINITY)],
            SPEED,
            f64::INFINITY,
        );
        assert_eq!(CentralDifference::default().fly(&barrier, Detail::End).unwrap().outcome, Outcome::Stopped);
        // A driven, overdamped projectile creeps to x = 10, where no force is left.
        let creep = stages(smallvec![stage(-1000.0, 100.0, 1000.0, 0.0, f64::INFINITY)], 1.0, f64::INFINITY);
        for velocity in VELOCITIES {
            let error = scheme(1e-3, velocity, Boundaries::Interpolated).fly(&creep, Detail::End).unwrap_err();
            let IntegrationError::NeverEnds { last, .. } = error else { unreachable!("{error}") };
            approx::assert_relative_eq!(last.depth, 10.0, max_relative = 1e-9);
        }
        // Overdamped by the step, V falls to zero exactly, where no force would hold it.
        let dashpot = stages(smallvec![stage(0.0, 0.0, 256.0, 0.0, f64::INFINITY)], 8.0, 10.0);
        let error = scheme(1.0 / 64.0, VelocityAt::LaggedHalfStep, Boundaries::StepEnd).fly(&dashpot, Detail::End);
        assert!(matches!(error, Err(IntegrationError::NeverEnds { .. })), "{error:?}");
        // A dashpot alone stops the projectile nowhere: V underflows to zero on the way, which is not rest.
        let dashpot = stages(smallvec![stage(0.0, 0.0, 200.0, 0.0, f64::INFINITY)], SPEED, 10.0);
        for velocity in VELOCITIES {
            let error = scheme(1e-3, velocity, Boundaries::Landed).fly(&dashpot, Detail::End).unwrap_err();
            assert!(matches!(error, IntegrationError::NeverEnds { .. }), "{velocity}: {error}");
        }
    }

    #[test]
    fn a_step_that_no_budget_suffices_for_is_refused_after_the_first_steps() {
        let semi_infinite = concrete(DRAG, 1.0, SPEED, f64::INFINITY);
        for problem in [semi_infinite.clone(), Problem { exit_depth: 0.05, ..semi_infinite.clone() }] {
            // The flight lasts 8e-4 s, or 2e-4 s, and a hundred million such steps a ten-thousandth of it at most.
            for step in [1e-16, 1e-300, f64::from_bits(10)] {
                for velocity in VELOCITIES {
                    let error = scheme(step, velocity, Boundaries::StepEnd).fly(&problem, Detail::End).unwrap_err();
                    let IntegrationError::StepBudgetSpent { last, .. } = error else { unreachable!("{error}") };
                    assert!(last.time < 1.1e6 * step && last.velocity > 0.99 * SPEED, "{last}");
                }
            }
        }
        // No time of the flight is too short where it ends, and none is known where the first stage drives.
        assert!(!cannot_end(&semi_infinite, 8.3e-7));
        // c x at the reach of V0 takes 450 of the 600 N s at most.
        assert!(cannot_end(&semi_infinite, 3.9e-7) && cannot_end(&semi_infinite, 2e-7));
        assert!(!cannot_end(&Problem { exit_depth: 5e-8, ..semi_infinite.clone() }, 2e-13));
        let mut driven = semi_infinite;
        driven.stages[0].static_force = -1e-300;
        assert!(!cannot_end(&driven, 1e-300));
    }

    #[test]
    fn a_spent_budget_and_an_overflow_are_errors_with_the_state_reached() {
        let problem = concrete(DRAG, 1.0, SPEED, f64::INFINITY);
        for detail in [Detail::End, Detail::Trajectory] {
            let scheme = CentralDifference { max_steps: 1000, ..scheme(1e-7, VelocityAt::Centred, Boundaries::Landed) };
            let error = scheme.fly(&problem, detail).unwrap_err();
            let IntegrationError::StepBudgetSpent { max_steps: 1000, last } = error else { unreachable!("{error}") };
            approx::assert_relative_eq!(last.time, 1e-4, max_relative = 1e-14);
        }
        // Exactly enough is enough.
        let steps =
            scheme(1e-6, VelocityAt::Centred, Boundaries::Landed).fly(&problem, Detail::End).unwrap().cost.steps;
        for (max_steps, enough) in [(steps, true), (steps - 1, false)] {
            let scheme = CentralDifference { max_steps, ..scheme(1e-6, VelocityAt::Centred, Boundaries::Landed) };
            assert_eq!(scheme.fly(&problem, Detail::End).is_ok(), enough);
        }
        let driven = stages(smallvec![stage(-1e300, 1e-300, 0.0, 0.0, f64::INFINITY)], SPEED, f64::INFINITY);
        let error = scheme(1e6, VelocityAt::Centred, Boundaries::Landed).fly(&driven, Detail::End).unwrap_err();
        assert!(matches!(error, IntegrationError::NotFinite { what: "depth", .. }), "{error}");
        let rough = stages(smallvec![Stage::tunnel(STRENGTH, 1e300)], 1e10, 1.0);
        for velocity in VELOCITIES {
            match scheme(1e-15, velocity, Boundaries::StepEnd).fly(&rough, Detail::End) {
                Ok(flight) => assert!(flight.end.velocity >= 0.0 && flight.end.depth.is_finite()),
                Err(error) => assert!(matches!(error, IntegrationError::NotFinite { .. }), "{error}"),
            }
        }
    }

    #[test]
    fn options_outside_their_domain_are_refused() {
        let problem = concrete(DRAG, 1.0, SPEED, f64::INFINITY);
        let steps = [
            Steps::Uniform(0.0),
            Steps::Uniform(-1e-6),
            Steps::Uniform(f64::NAN),
            Steps::Uniform(f64::INFINITY),
            Steps::Given(vec![]),
            Steps::Given(vec![1e-6, 0.0]),
            Steps::Given(vec![1e-6, f64::NAN]),
        ];
        for steps in steps {
            let scheme = CentralDifference { steps, ..CentralDifference::default() };
            assert!(scheme.fly(&problem, Detail::End).unwrap_err().is_usage());
            assert!(scheme.free_states(&problem, 1).unwrap_err().is_usage());
        }
        let scheme = CentralDifference { max_steps: 0, ..CentralDifference::default() };
        assert!(scheme.fly(&problem, Detail::End).unwrap_err().is_usage());
        // A step that is zero as an f32 is no step in f32.
        let scheme = CentralDifference { steps: Steps::Uniform(1e-60), ..CentralDifference::default() };
        assert!(scheme.fly_in(&problem.cast::<f32>(), Detail::End).unwrap_err().is_usage());
        for velocity in VELOCITIES {
            assert_eq!(velocity.to_string().parse::<VelocityAt>().unwrap(), velocity);
        }
        for boundaries in BOUNDARIES {
            assert_eq!(boundaries.to_string().parse::<Boundaries>().unwrap(), boundaries);
        }
        let error = "late".parse::<VelocityAt>().unwrap_err().to_string();
        assert_eq!(error, "--velocity = late is not allowed: lagged, centred or predicted");
    }

    #[test]
    fn other_numbers_fly_the_same_path() {
        let problem = concrete(DRAG, 0.6, SPEED, f64::INFINITY);
        for (velocity, boundaries) in combinations() {
            let scheme = scheme(3e-6, velocity, boundaries);
            let flight = scheme.fly(&problem, Detail::Events).unwrap();
            let close = |other: Flight, tolerance: f64| {
                assert_eq!(kinds(&flight), kinds(&other));
                approx::assert_relative_eq!(flight.end.depth, other.end.depth, max_relative = tolerance);
            };
            close(scheme.fly_in(&problem.cast::<f32>(), Detail::Events).unwrap().values(), 1e-4);
            close(scheme.fly_in(&problem.cast::<twofloat::TwoFloat>(), Detail::Events).unwrap().values(), 1e-13);
            let mut dual = problem.cast::<num_dual::Dual64>();
            dual.impact_speed.eps = 1.0;
            let dual = scheme.fly_in(&dual, Detail::Events).unwrap();
            if boundaries == Boundaries::Landed {
                // The derivative by V0 of the located depth, against a central quotient. The number of steps does not
                // change within it.
                let at = |speed: f64| {
                    let problem = Problem { impact_speed: speed, ..problem.clone() };
                    scheme.fly(&problem, Detail::End).unwrap().end.depth
                };
                let quotient = (at(SPEED + 1e-3) - at(SPEED - 1e-3)) / 2e-3;
                approx::assert_relative_eq!(dual.end.depth.eps, quotient, max_relative = 1e-4);
            }
            close(dual.values(), 1e-15);
        }
    }

    #[test]
    fn a_constant_source_is_a_smaller_static_force_and_an_end_in_time_changes_the_law() {
        let law = stage(STRENGTH, 2e5, 30.0, DRAG, f64::INFINITY);
        let driven = Stage { static_force: STRENGTH - 4e5, ..law };
        for velocity in VELOCITIES {
            let scheme = scheme(1e-6, velocity, Boundaries::Landed);
            let plain = scheme.free_states(&stages(smallvec![driven], SPEED, f64::INFINITY), 101).unwrap();
            let forced = stages(smallvec![law, law], SPEED, f64::INFINITY);
            let pushed = scheme.forced_states(&forced, |_, _| 4e5, &[100.5e-6]).unwrap();
            assert_eq!(pushed.len(), 102);
            for (a, b) in plain.iter().zip(&pushed) {
                assert!((a.depth - b.depth).abs() <= 1e-15, "{a} {b}");
            }
            // 2e5 N for 50.5 µs, then none: the difference of the momenta is the impulse, whatever the steps.
            let [first, second] = [[2e5, 0.0], [0.0, 0.0]].map(|push| {
                let weightless = Stage { drag: 0.0, viscosity: 0.0, stiffness: 0.0, ..law };
                let forced = stages(smallvec![weightless, weightless], SPEED, f64::INFINITY);
                scheme.forced_states(&forced, |j, _| push[j], &[50.5e-6, 90e-6]).unwrap().pop().unwrap()
            });
            assert!((first.time - 90e-6).abs() < 1e-18);
            assert!((MASS * (first.velocity - second.velocity) / (2e5 * 50.5e-6) - 1.0).abs() < 1e-12);
        }
        let short = CentralDifference { max_steps: 10, ..scheme(1e-6, VelocityAt::Centred, Boundaries::Landed) };
        let problem = stages(smallvec![law], SPEED, f64::INFINITY);
        let spent = short.forced_states(&problem, |_, _| 0.0, &[1e-4]).unwrap_err();
        assert!(matches!(spent, IntegrationError::StepBudgetSpent { max_steps: 10, .. }), "{spent}");
        assert!(short.forced_states(&problem, |_, _| 0.0, &[1e-4, 2e-4]).unwrap_err().is_usage());
        assert!(short.forced_states(&problem, |_, _| 0.0, &[]).unwrap_err().is_usage());
    }

    #[test]
    fn compensated_sums_lose_less_to_rounding() {
        let problem = spring(2300.0).cast::<f32>();
        let step = f64::from(1e-3_f32 / 2300.0);
        let worst = |summation| {
            let scheme =
                CentralDifference { summation, ..scheme(step, VelocityAt::LaggedHalfStep, Boundaries::StepEnd) };
            let w = (f64::from(problem.stages[0].stiffness) / MASS).sqrt();
            let theta = 2.0 * f64::asin(0.5 * w * step);
            let amplitude = SPEED * step / theta.sin();
            let states = scheme.free_states(&problem, 20_000).unwrap();
            let errors = states
                .iter()
                .enumerate()
                .map(|(i, state)| (f64::from(state.depth) / amplitude - (i as f64 * theta).sin()).abs());
            errors.fold(0.0, f64::max)
        };
        let (plain, compensated) = (worst(Summation::Plain), worst(Summation::Compensated));
        println!("f32, 20 000 steps: plain {plain:.1e}, compensated {compensated:.1e}");
        assert!(compensated * 10.0 < plain, "plain {plain:e}, compensated {compensated:e}");
    }

    #[test]
    fn each_scale_of_a_stage_sets_the_default_step_where_it_is_the_shortest() {
        // M = 2, all numbers chosen by hand so that one scale is the shortest, a power of two. In front of a stage
        // that starts deeper lies one without any force.
        let none = f64::INFINITY;
        let free = |end| stage(0.0, 0.0, 0.0, 0.0, end);
        let cases: [(&[Stage], f64, f64, f64); 7] = [
            // The second of two stages is crossed in (5/4 - 1)/V0.
            (&[free(1.0), free(none)], 4.0, 1.25, 1.0 / 16.0),
            // sqrt(M/s), as the drive leaves no more than 256 N at either end.
            (&[stage(-256.0, 8192.0, 0.0, 0.0, none)], 4.0, none, 1.0 / 64.0),
            // M V0/(p + s x) with 64 N where the spring is compressed most, at x = 4 + V0 sqrt(M/s) = 6.
            (&[free(4.0), stage(16.0, 8.0, 0.0, 0.0, none)], 4.0, none, 1.0 / 8.0),
            // The same where it is compressed least, with -32 N at x = 4 and -16 N at x = 6.
            (&[free(4.0), stage(-64.0, 8.0, 0.0, 0.0, none)], 4.0, none, 1.0 / 4.0),
            // M/r, and M/(q V0).
            (&[stage(0.0, 0.0, 64.0, 0.0, none)], 4.0, none, 1.0 / 32.0),
            (&[stage(0.0, 0.0, 0.0, 16.0, none)], 4.0, none, 1.0 / 32.0),
            // Without speed no time is needed to stop: M/r alone.
            (&[stage(4.0, 0.0, 2.0, 1.0, none)], 0.0, none, 1.0),
        ];
        for (list, speed, exit_depth, scale) in cases {
            let problem = stages(list.iter().copied().collect(), speed, exit_depth);
            assert_eq!(default_time_step(&problem, VelocityAt::Centred), scale / 1e3, "{list:?}");
        }
        // A film of 2^-20 m or a fast dashpot deserves no more than 1e6 steps in what lies behind it.
        let film = free(2.0_f64.powi(-20));
        let cases: [(&[Stage], f64, f64); 3] = [
            // M V0/p, and M/sqrt(p q), which also is there without speed.
            (&[film, stage(2.0, 0.0, 0.0, 0.0, none)], 4.0, 4.0),
            (&[film, stage(2.0, 0.0, 0.0, 8.0, none)], 4.0, 0.5),
            (&[stage(0.0, 0.0, 2.0_f64.powi(24), 0.0, 1.0), stage(4.0, 0.0, 0.0, 1.0, none)], 0.0, 1.0),
        ];
        for (list, speed, scale) in cases {
            let problem = stages(list.iter().copied().collect(), speed, none);
            assert_eq!(default_time_step(&problem, VelocityAt::Centred), scale / 1e6, "{list:?}");
        }
    }

    #[test]
    fn the_limit_itself_is_unstable_and_a_stage_without_a_step_has_none() {
        let w = 1024.0;
        let flown = |problem: &Problem, step| {
            scheme(step, VelocityAt::Centred, Boundaries::StepEnd)
                .fly(problem, Detail::End)
                .unwrap()
                .step_limit
                .unwrap()
        };
        let told = flown(&spring(w), 2.0 / w);
        assert_eq!((told.limit, told.stable), (2.0 / w, false));
        assert!(flown(&spring(w), (2.0 / w).next_down()).stable);
        let layer = stage(0.0, 1e12, 0.0, 0.0, 0.0);
        let faced = stages(smallvec![layer, Stage::tunnel(STRENGTH, 0.0)], SPEED, f64::INFINITY);
        assert_eq!(flown(&faced, 1e-5).limit, f64::INFINITY);
    }

    #[test]
    fn what_lies_behind_the_exit_is_never_felt() {
        let law = stage(STRENGTH, 1e7, 30.0, DRAG, f64::INFINITY);
        let exit_depth: f64 = 0.01;
        for (velocity, boundaries) in combinations() {
            let scheme = CentralDifference { max_steps: 1000, ..scheme(3.3e-6, velocity, boundaries) };
            let alone = scheme.fly(&stages(smallvec![law], SPEED, exit_depth), Detail::Events).unwrap();
            for end in [exit_depth, exit_depth.next_up(), 0.0101] {
                let list = smallvec![Stage { end, ..law }, Stage::tunnel(1e9, 1e3)];
                let backed = scheme.fly(&stages(list, SPEED, exit_depth), Detail::Events).unwrap();
                assert_eq!((backed.end, backed.stage), (alone.end, 0), "{velocity} {boundaries} {end}");
                assert_eq!((backed.cost, backed.exit_margin), (alone.cost, alone.exit_margin));
            }
        }
    }

    #[test]
    fn an_outer_force_that_grows_with_time_gives_the_exact_discrete_cubic() {
        // M x'' = 6 M k t: the second difference of t³ is 6 t dt² exactly, and V(1/2) = V0 asks for x = V0 dt after
        // the first step, so x(i) = V0 t + k t (t² - dt²).
        let (k, step) = (64.0, 1.0 / 64.0);
        let free = stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, f64::INFINITY)], 8.0, f64::INFINITY);
        for velocity in VELOCITIES {
            let scheme = scheme(step, velocity, Boundaries::Landed);
            let states = scheme.forced_states(&free, |_, t| 6.0 * MASS * k * t, &[0.25]).unwrap();
            assert_eq!(states.len(), 17);
            for (i, state) in states.iter().enumerate() {
                let t = i as f64 * step;
                assert_eq!((state.time, state.depth), (t, 8.0 * t + k * t * (t * t - step * step)), "{velocity}");
            }
            // Sixteen steps are enough for sixteen, fifteen are not.
            for (max_steps, enough) in [(16, true), (15, false)] {
                let scheme = CentralDifference { max_steps, ..scheme.clone() };
                assert_eq!(scheme.forced_states(&free, |_, _| 0.0, &[0.25]).is_ok(), enough);
            }
        }
    }

    #[test]
    fn a_flight_without_an_end_is_told_where_it_begins_to_be_one() {
        let endless = |scheme: &CentralDifference, problem: &Problem| {
            let error = scheme.fly(problem, Detail::End).unwrap_err();
            let IntegrationError::NeverEnds { last, .. } = error else { unreachable!("{error}") };
            last
        };
        for last in [stage(0.0, 0.0, 1.0, 1.0, f64::INFINITY), stage(-5.0, 0.0, 1.0, 1.0, f64::INFINITY)] {
            let problem = stages(smallvec![last], SPEED, f64::INFINITY);
            for (velocity, boundaries) in combinations() {
                let scheme = CentralDifference { max_steps: 10, ..scheme(1e-6, velocity, boundaries) };
                assert_eq!(endless(&scheme, &problem), State::at_impact(&problem));
            }
        }
        // A dashpot with r dt/M = 2 takes all of V in the first half step, and nothing would hold the projectile there.
        let dashpot = stages(smallvec![stage(0.0, 0.0, 256.0, 0.0, f64::INFINITY)], 8.0, 10.0);
        let short = scheme(1.0 / 64.0, VelocityAt::LaggedHalfStep, Boundaries::StepEnd);
        assert_eq!(endless(&short, &dashpot), State::at_impact(&dashpot));
        // The slowest of all speeds moves nothing in a step of 1 ms: told after 2^20 of them.
        let slowest = f64::from_bits(1);
        let creep = stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, f64::INFINITY)], slowest, 1.0);
        let scheme =
            CentralDifference { max_steps: 3 << 20, ..scheme(1e-3, VelocityAt::LaggedHalfStep, Boundaries::StepEnd) };
        let last = endless(&scheme, &creep);
        assert_eq!(last, State { time: 1_048_576.0 * 1e-3, depth: 0.0, velocity: slowest });
        // As many steps that do move are no standstill: 3/2 2^20 of them to a place one metre away.
        let slow = Problem { impact_speed: 2.0_f64.powi(20) / 1.5, exit_depth: 1.0, ..creep };
        let step = 2.0_f64.powi(-40);
        let flight = CentralDifference { steps: Steps::Uniform(step), ..scheme }.fly(&slow, Detail::End).unwrap();
        assert!(flight.cost.steps.abs_diff(3 << 19) <= 1, "{}", flight.cost.steps);
    }

    #[test]
    fn the_quadratic_of_the_centred_rule_has_a_finite_derivative_where_its_roots_meet() {
        // half q V² + V = u - half p with half = 1/2, p = 4, q = 1/2, u = 1: V = -2 twice. F = p + q V² = 6 there, and
        // by V = 2 (u - half p), the vertex, dF/du = 2 q V dV/du = -4.
        let law = stage(4.0, 0.0, 0.0, 0.5, f64::INFINITY);
        let law = stages(smallvec![law], 1.0, 1.0).cast::<num_dual::Dual64>().stages[0];
        let zero = num_dual::Dual64::from_re(0.0);
        let force = Centred::deceleration(&law, zero, num_dual::Dual64::from_re(1.0).derivative(), zero + 0.5);
        assert_eq!((force.re, force.eps), (6.0, -4.0));
    }

    #[test]
    fn the_method_has_its_name() {
        assert_eq!(CentralDifference::default().name(), "central-difference");
    }

    #[test]
    fn nodes_in_double_double_are_the_exact_discrete_solution_to_30_digits() {
        // Equations 6 to 8 in 256 bits from the same numbers, V* by its definition; M = 3, so that no coefficient
        // divided by it is a double-double.
        type Big = dashu_float::FBig<dashu_float::round::mode::HalfEven, 2>;
        let big = |value: f64| Big::try_from(value).unwrap().with_precision(256).value();
        let step = 7e-6;
        let law = stage(8e5, 7e6, 400.0, 3.1, f64::INFINITY);
        let problem = Problem { mass: 3.0, ..stages(smallvec![law], SPEED, f64::INFINITY) };
        let [m, h, p, s, r, q, v0, two] =
            [3.0, step, law.static_force, law.stiffness, law.viscosity, law.drag, SPEED, 2.0].map(big);
        let half = &h / &two;
        let deceleration = |x: &Big, v: &Big| (&p + &s * x + &r * v + &q * v * v) / &m;
        for velocity in VELOCITIES {
            let evaluated_at = |x: &Big, u: &Big| match velocity {
                VelocityAt::LaggedHalfStep => u.clone(),
                VelocityAt::PredictedHalfStep => u - &half * deceleration(x, u),
                VelocityAt::Centred => {
                    // The root of V + dt/2 F(x, V)/M = u.
                    let (a, b) = (&half * &q / &m, big(1.0) + &half * &r / &m);
                    let c = &half * (&p + &s * x) / &m - u;
                    ((&b * &b - &two * &two * &a * c).sqrt() - b) / (&two * a)
                }
            };
            let scheme = scheme(step, velocity, Boundaries::StepEnd);
            let states = scheme.free_states(&problem.cast::<twofloat::TwoFloat>(), 101).unwrap();
            let (mut x, mut v) = (big(0.0), v0.clone());
            let mut d = deceleration(&x, &v);
            let mut u = &v0 + &half * &d;
            for state in &states {
                let off = |number: twofloat::TwoFloat, exact: &Big, scale: &Big| {
                    ((big(number.hi()) + big(number.lo()) - exact) / scale).to_f64().value().abs()
                };
                let errors = (off(state.depth, &x, &(&v0 * &h)), off(state.velocity, &v, &v0));
                assert!(errors.0 < 1e-29 && errors.1 < 1e-30, "{velocity}: {errors:?}");
                u -= &h * &d;
                x += &h * &u;
                d = deceleration(&x, &evaluated_at(&x, &u));
                v = &u - &half * &d;
            }
        }
    }

    #[test]
    fn places_located_in_double_double_are_those_of_the_parabola_to_30_digits() {
        // A constant force: X = M V0²/(2 p), T = M V0/p, and V² = V0² - 2 p x/M at the end of a stage on the way.
        use twofloat::TwoFloat;
        let law = |end| stage(7e5, 0.0, 0.0, 0.0, end);
        let two_stages = stages(smallvec![law(0.05), law(f64::INFINITY)], SPEED, f64::INFINITY);
        let problem = Problem { mass: 3.0, ..two_stages }.cast::<TwoFloat>();
        let (mass, speed, force) = (problem.mass, problem.impact_speed, problem.stages[0].static_force);
        let depth = (mass * speed * speed).over(force + force);
        let time = (mass * speed).over(force);
        for velocity in VELOCITIES {
            for boundaries in [Boundaries::Interpolated, Boundaries::Landed] {
                let flight = scheme(7e-6, velocity, boundaries).fly_in(&problem, Detail::Events).unwrap();
                let at_end = flight.events[0].state;
                let squared = speed * speed - ((force + force) * at_end.depth).over(mass);
                let passed = (speed - at_end.velocity) * mass.over(force);
                let off = [
                    (flight.end.depth - depth).over(depth),
                    (flight.end.time - time).over(time),
                    (at_end.velocity * at_end.velocity - squared).over(squared),
                    (at_end.time - passed).over(passed),
                ]
                .map(|error| error.value().abs());
                assert!(off.iter().all(|error| *error < 1e-29), "{velocity} {boundaries}: {off:?}");
            }
        }
    }
}
