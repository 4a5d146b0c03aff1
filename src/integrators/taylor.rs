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
//! one, and scenes of any magnitude run alike, in `f32` as well.
//!
//! **Step.** Truncating after order K leaves about `|v(K)| h^K`, so `h` makes that `tolerance` times the velocity, for
//! the last two orders: every second coefficient may vanish (`docs/theory.md`, section 2). The series of the tunnel has its
//! nearest pole on the real axis, in the past, and the coefficients see it. The series of a stage without drag is
//! entire: its step is capped by `w h <= 1.8`, so that no oscillation hides inside (proof 3 of [`super::locate`]). Where
//! the force falls with depth, s < 0, the series is that of an exponential, `w² = |s|/M`, and the cap only bounds its growth.
//!
//! **Work.** Drag costs a convolution, half of it by symmetry, with the factor of `v[k]` taken out of the sum (it is
//! `r + 2 q v[0]`, so viscosity is free). Without drag the recurrence has two terms, and for a constant force the
//! series ends. Which of these holds is decided once per stage.
//!
//! Source of the step rule: Jorba, Zou (2005), A software package for the numerical integration of ODEs by means of
//! high-order Taylor methods, Experimental Mathematics 14, section 3.

#![expect(clippy::inline_always, reason = "measured: one flight is one function, 1.3 times faster than with calls")]

use std::marker::PhantomData;

use super::flight::{self, Course, StageEnd, StageSolver};
use super::law_series::{LawSeries, Variable};
use super::locate::{self, Closing, Found};
use super::outcome::{Detail, Flight, IntegrationError, Integrator};
use crate::physics::exit_energy;
use crate::physics::scalar::reciprocal;
use crate::physics::{Problem, Scalar, Stage, State};

/// Steps allowed for one flight. A resisting scene takes two to a few dozen; a stiff driven one thousands.
pub(super) const STEPS_MAX: u64 = 100_000;

/// Largest `w h` of a step, `w² = s/M`: more than the quarter period to rest, `pi/2`, and less than the half period
/// `pi` in which V could vanish twice.
const PHASE_MAX: f64 = 1.8;

/// Longest step in its own unit of time. No flight needs more, and beyond it coefficients that underflow would count.
const SPAN_MAX: f64 = 64.0;

/// Least unit of depth (m), `2^-900`: depths in this unit are numbers.
const LEAST_UNIT_DEPTH: f64 = f64::from_bits((1023 - 900) << 52);

/// How much nearer to the start of a step than to its end a boundary lies that is searched from the start.
const NEAR_START: f64 = 16.0;

/// Most stages that are explained one by one.
const EXPLAINED_MAX: usize = 64;

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
/// use penetrode::physics::{Outcome, Problem, Stage};
///
/// // Constant resistance: X = M V0²/(2 P), T = M V0/P.
/// let problem = Problem::crater_and_tunnel(2.0, 300.0, None, Stage::tunnel(1.0e6, 0.0));
/// let flight = Taylor::default().solve(&problem, Detail::Events)?;
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
        if (0.0..=0.1).contains(&rtol) {
            Ok(Self { tolerance: Some(rtol) })
        } else {
            Err(IntegrationError::bad_option("rtol", &rtol, "a number from 0 (round-off) to 0.1"))
        }
    }

    /// Truncation error of one step relative to the velocity, in the number type `S`.
    pub fn tolerance_in<S: Scalar>(&self) -> f64 {
        // What is neglected is smaller than the last term used, which is made equal to this: by a factor of six at the
        // usual ratio of step and radius. Measured over random scenes, the errors then stay below `rtol`.
        self.tolerance.map_or(0.0, |rtol| 2.0 * rtol).max(S::EPSILON)
    }

    /// Solves `problem` in the number type `S`, with the order that suits its round-off. See [`Integrator::solve`], which
    /// chooses the order by the tolerance.
    ///
    /// In dual numbers the derivative parts of the end state are those of the event: its time and place move with
    /// the parameter, as they should. Boundaries are compared by value.
    ///
    /// # Errors
    /// [`IntegrationError::NeverEnds`] where nothing stops the projectile and no exit is reached,
    /// [`IntegrationError::StepBudgetSpent`] after 100,000 steps, [`IntegrationError::NotFinite`].
    pub fn solve_in<S: Scalar>(&self, problem: &Problem<S>, detail: Detail) -> Result<Flight<S>, IntegrationError> {
        let steps = Steps::new(self.tolerance_in::<S>());
        if Precision::<S>::IS_SINGLE {
            flight::solve(problem, detail, &mut Orders::<12, 18>(steps))
        } else if Precision::<S>::IS_DOUBLE {
            flight::solve(problem, detail, &mut Orders::<22, 24>(steps))
        } else {
            flight::solve(problem, detail, &mut Orders::<40, 48>(steps))
        }
    }
}

/// How it solves stages with laws of their own.
pub(super) const fn law_series(tolerance: f64) -> LawSeries {
    LawSeries { method: "taylor", variable: Variable::Time, tolerance }
}

/// Branches by a constant: the orders of the other number types are not compiled.
pub(super) struct Precision<S>(PhantomData<S>);

impl<S: Scalar> Precision<S> {
    pub(super) const IS_SINGLE: bool = S::EPSILON > 1e-9;
    pub(super) const IS_DOUBLE: bool = S::EPSILON > 1e-17;
}

impl Integrator for Taylor {
    fn name(&self) -> &'static str {
        "taylor"
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        // Least work near order -ln(tolerance)/2 where a coefficient costs a convolution; two-term recurrences
        // (second number) may go further and cross a crater in one step.
        let tolerance = self.tolerance_in::<f64>();
        let steps = Steps::new(tolerance);
        if tolerance > 1e-5 {
            flight::solve(problem, detail, &mut Orders::<8, 10>(steps))
        } else if tolerance > 1e-9 {
            flight::solve(problem, detail, &mut Orders::<12, 18>(steps))
        } else if tolerance > 1e-13 {
            flight::solve(problem, detail, &mut Orders::<16, 20>(steps))
        } else {
            self.solve_in(problem, detail)
        }
    }

    fn explain(&self, problem: &Problem, flight: &Flight) -> Vec<String> {
        let treatment = |index: usize, law: &Stage| match Shape::of(law) {
            _ if problem.laws.of(index).is_some_and(|law| law.table().is_some()) => {
                "a table of velocity: integrals over it on each of its pieces, F = p + r V"
            }
            _ if problem.laws.of(index).is_some_and(|law| law.is_of_velocity() && law.end().is_none()) => {
                "a law of its own, of the velocity alone: integrals over it, series where a few places do not show it"
            }
            _ if problem.laws.of(index).is_some_and(|law| law.by_square_of_v().is_some() && law.end().is_none()) => {
                "a law of its own, p(x) + q(x) V²: integrals over depth, series where a few places do not show it"
            }
            _ if problem.laws.of(index).is_some() => {
                "a law of its own: series of its expression, over time or velocity"
            }
            Shape::Constant => "constant force: the series ends, one step serves",
            Shape::Spring if law.stiffness < 0.0 => {
                "a force that falls with depth: recurrence of one term, no convolution"
            }
            Shape::Spring => "a spring alone: recurrence of one term, no convolution",
            Shape::Linear => "no drag: recurrence of two terms, no convolution",
            Shape::Drag => "no stiffness: V monotone, no search for hidden roots",
            Shape::General => "stiffness and drag: earliest root isolated on every step",
        };
        let solved = problem.stages.iter().take(flight.stage + 1);
        let solved = solved.enumerate();
        if flight.stage >= EXPLAINED_MAX {
            let mut counts: Vec<(&str, usize)> = Vec::new();
            for kind in solved.map(|(index, law)| treatment(index, law)) {
                match counts.iter_mut().find(|(known, _)| *known == kind) {
                    Some((_, count)) => *count += 1,
                    None => counts.push((kind, 1)),
                }
            }
            return counts.into_iter().map(|(kind, count)| format!("{count} stages: {kind}")).collect();
        }
        solved.map(|(index, law)| format!("stage {index}: {}", treatment(index, law))).collect()
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
                advance[k] = v[k] * reciprocal(k + 1);
                let mut rest = S::zero();
                if DRAG {
                    pull[k] = twice_drag * v[k];
                    if k % 2 == 0 {
                        rest = S::from_f64(0.5) * (pull[k / 2] * v[k / 2]);
                    }
                    // The newest coefficient comes last: the rest of the sum is ready before it is.
                    for i in (1..k.div_ceil(2)).rev() {
                        rest += pull[i] * v[k - i];
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
}

/// `log2 |x|` plus the exponent bias, 0 to 0.087 too small: exponent and significand read as one number.
#[inline(always)]
pub(super) fn rough_log2(x: f64) -> f64 {
    x.abs().to_bits().cast_signed() as f64 * (1.0 / (1_u64 << 52) as f64)
}

/// `2^y` times a factor from 0.94 to 1, for -1000 < y; at most `2^1000`.
#[inline(always)]
pub(super) fn rough_exp2(y: f64) -> f64 {
    let bits = (y.clamp(-1000.0, 1000.0) + 1023.0) * (1_u64 << 52) as f64;
    0.94 * f64::from_bits((bits as i64).cast_unsigned())
}

/// The power of two at or below a positive number (the least normal number for what is smaller).
#[inline(always)]
pub(super) fn power_of_two_below(x: f64) -> f64 {
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

/// The series as a method of the loop; orders `K - 1` with drag and `L - 1` without.
struct Orders<const K: usize, const L: usize>(Steps);

/// How steps are chosen, whatever their order.
struct Steps {
    tolerance: f64,
    /// When a trial for an event is the last.
    closing: Closing,
}

impl<S: Scalar, const K: usize, const L: usize> StageSolver<S> for Orders<K, L> {
    #[inline(always)]
    fn solve_stage(&mut self, course: &mut Course<'_, S>) -> Result<StageEnd<S>, IntegrationError> {
        let law = &course.stages[course.stage];
        let limit = course.limit()?;
        if let Some(law) = course.law() {
            return law_series(self.0.tolerance).solve(course, law, limit);
        }
        match Shape::of(law) {
            Shape::Constant => self.0.step_through::<S, 4, false, false, false>(course, limit),
            Shape::Spring => self.0.step_through::<S, L, true, false, false>(course, limit),
            Shape::Linear => self.0.step_through::<S, L, true, false, true>(course, limit),
            Shape::Drag => self.0.step_through::<S, K, false, true, true>(course, limit),
            Shape::General => self.0.step_through::<S, K, true, true, true>(course, limit),
        }
    }
}

impl Steps {
    fn new(tolerance: f64) -> Self {
        Self { tolerance, closing: Closing::new(tolerance) }
    }

    fn step_through<S: Scalar, const N: usize, const SPRING: bool, const DRAG: bool, const DAMPED: bool>(
        &self,
        course: &mut Course<'_, S>,
        limit: S,
    ) -> Result<StageEnd<S>, IntegrationError> {
        let problem = course.problem;
        let stage = &course.stages[course.stage];
        // Coefficients per unit mass, once a stage.
        let Stage { static_force, stiffness, viscosity, drag, .. } = stage.per_mass(problem.mass);
        let frequency = if SPRING { stiffness.value().abs().sqrt() } else { 0.0 };
        // Only a driven stage with both springs and dashpots can creep towards its equilibrium for ever.
        let may_creep = SPRING && stage.static_force.value() < 0.0 && viscosity.value() >= 2.0 * frequency;
        // Judged again at each step: what is a rounding at the start of a stage is all of the speed that is left.
        let may_vanish = DAMPED && viscosity.value() > 0.0 && static_force.value() == 0.0 && stiffness.value() == 0.0;

        while course.cost.steps < STEPS_MAX {
            // Units: velocity and time, powers of two. The time is the shortest of V/|a|, M/r, M/(q V), 1/w, or,
            // where no force acts, that to the limit.
            let State { time, depth, velocity } = course.state;
            let at_start = static_force + stiffness * depth;
            let speed = velocity.value();
            let rate = at_start.value().abs() + speed * (viscosity.value() + drag.value() * speed + frequency);
            let distance = limit.value() - depth.value();
            let (fastest, scale) = if !SPRING && !DRAG && at_start.value() < 0.0 {
                // The one step of a constant drive reaches the limit, however slow its start.
                let fastest = speed.hypot((-2.0 * at_start.value()).sqrt() * distance.sqrt());
                (fastest, 2.0 * distance / (speed + fastest))
            } else {
                (speed, if rate > 0.0 { speed / rate } else { distance / speed })
            };
            let mut unit_velocity = power_of_two_below(fastest);
            let unit_time = power_of_two_below(scale);
            let mut unit_depth = unit_velocity * unit_time;
            if unit_depth < LEAST_UNIT_DEPTH {
                // Next to no speed and a force: rest is nearer than depths can say.
                (unit_velocity, unit_depth) = (LEAST_UNIT_DEPTH / unit_time, LEAST_UNIT_DEPTH);
            }
            let law = Stage {
                // The quotient of the units alone may leave the range of numbers.
                static_force: at_start * S::from_f64(unit_time) * S::from_f64(1.0 / unit_velocity),
                stiffness: if SPRING { stiffness * S::from_f64(unit_time * unit_time) } else { S::zero() },
                viscosity: viscosity * S::from_f64(unit_time),
                drag: if DRAG { drag * S::from_f64(unit_depth) } else { S::zero() },
                end: (limit - depth) * S::from_f64(1.0 / unit_depth),
            };
            if may_creep {
                course.refuse_creep(limit.value())?;
            }
            if may_vanish && course.is_only_approached(limit.value()) {
                let why = "a resistance that vanishes with the velocity brings it to nothing before the boundary";
                return Ok(StageEnd::Approach(course.state, why));
            }
            let start =
                State { time: S::zero(), depth: S::zero(), velocity: velocity * S::from_f64(1.0 / unit_velocity) };

            let series = Series::<S, N>::new::<SPRING, DRAG, DAMPED>(&law, start.velocity);
            course.cost.steps += 1;
            course.cost.force_evaluations += if SPRING || DRAG { N as u64 - 1 } else { 1 };
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
            if !next.is_finite() {
                return Err(IntegrationError::NotFinite { what: "the state", last: course.state.values() });
            }
            if matches!(course.detail, Detail::Times(_)) {
                // A copy: nothing may refer to the polynomials themselves, which are kept in registers.
                let inside = series;
                course.sample_until(next, |at| {
                    let local = inside.at((at - time.value()) / unit_time);
                    State {
                        time: S::from_f64(at),
                        depth: depth + local.depth * S::from_f64(unit_depth),
                        velocity: local.velocity * S::from_f64(unit_velocity),
                    }
                });
            }
            self.widen_bound(course, &law, &start, &local, unit_velocity, next.depth.value() / unit_depth);
            match step {
                Step::Whole(_) => {
                    course.state = next;
                    course.sample(next);
                }
                Step::Rest(_) if next.depth.value() < limit.value() => return Ok(StageEnd::Rest(next)),
                Step::Limit(_) | Step::Rest(_) => return Ok(StageEnd::Limit(next)),
            }
        }
        let remedy = if cfg!(feature = "diffsol") {
            "the stage is stiff: take --method adaptive"
        } else {
            "the stage is stiff: a build with the feature diffsol has --method adaptive for it"
        };
        Err(IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, remedy, last: course.state.values() })
    }

    /// Adds the error of one step to the error bound of `W/V0²`, in energy over depth, where it never grows:
    ///
    /// ```text
    /// d(dW)/dx = -(r/V + 2 q) dW/M,  so  dW -> dW e^-(r t/M + 2 q x/M)  over the step
    /// ```
    ///
    /// bounded by [`exit_energy::exp_from_below`], so a drag that reduces W by 1e30 also reduces its error bound by nearly
    /// 1e30.
    ///
    /// A step adds `2 V dV` for V: three roundings of the greatest (the sum of the series cannot exceed a few times V,
    /// the time of the step is short of its radius) and one tolerance of truncation; and `2 F dx/M`, `F` the sum of the
    /// magnitudes of its terms, for the depth, which is rounded relative to its whole, and for the force, which is off
    /// by roundings of its terms over the distance of the step. A force jump needs nothing more: both sides are integrated
    /// up to the exact boundary. Measured over random scenes, the error is at most half of the bound.
    #[inline(always)]
    fn widen_bound<S: Scalar>(
        &self,
        course: &mut Course<'_, S>,
        law: &Stage<S>,
        start: &State<S>,
        end: &State<S>,
        unit_velocity: f64,
        depth: f64,
    ) {
        let (v0, v1) = (start.velocity.value(), end.velocity.value());
        let fastest = v0.max(v1);
        let distance = end.depth.value();
        let (r, q) = (law.viscosity.value(), law.drag.value());
        let force =
            law.static_force.value().abs() + law.stiffness.value().abs() * distance + (r + q * fastest) * fastest;
        let relative = unit_velocity / course.problem.impact_speed.value();
        let rounding = 6.0 * fastest * fastest + 3.0 * force * (depth + 2.0 * distance);
        let added = S::EPSILON.max(f64::EPSILON) * rounding + 2.0 * self.tolerance * fastest * fastest;
        course.error_bound = course.error_bound
            / exit_energy::exp_from_below(r * end.time.value() + 2.0 * q * distance)
            + relative * relative * added;
    }
}

/// The event of a step on which the sign of V at the end shows whether V vanished (proofs 2, 3 and 5 of `locate`).
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
    let (v, distance) = (start.velocity.value(), law.end.value());
    let cost = distance * (2.0 * law.static_force.value() + law.stiffness.value() * distance);
    let within_reach = distance < f64::INFINITY && cost < 1.01 * v * v;
    if within_reach {
        match locate::passage(law, at, start, span, false, closing) {
            Found::Inside(state) => return Step::Limit(state),
            Found::Beyond(state) => return Step::Whole(state),
            Found::RestFirst => {}
        }
    }
    match locate::rest(law, at, start, span, closing) {
        Found::Inside(rest) if within_reach && rest.depth.value() >= distance => {
            through(locate::passage(law, at, rest, rest.time.value(), true, closing))
        }
        Found::Inside(rest) => Step::Rest(rest),
        Found::Beyond(end) if within_reach && end.depth.value() >= distance => {
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
    let distance = law.end.value();
    // The time of a boundary has the round-off of the time from which it is searched.
    let pass = |end: State<S>| {
        let start = if NEAR_START * distance < end.depth.value() { at(0.0) } else { end };
        through(locate::passage(law, at, start, end.time.value(), true, closing))
    };
    if let Some(root) = locate::first_root(&series.velocity.map(Scalar::value), span) {
        // The root is isolated; correct it in the number type, from the nearest trial.
        let rest = match locate::rest(law, at, at(root), span, closing) {
            Found::Inside(rest) => rest,
            _ => State { velocity: S::zero(), ..at(root) },
        };
        return if rest.depth.value() >= distance { pass(rest) } else { Step::Rest(rest) };
    }
    let end = at(span);
    if end.depth.value() >= distance { pass(end) } else { Step::Whole(end) }
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
mod tests;
