//! The method `energy`: kinetic energy over depth, then time over whichever variable is regular there.
//!
//! With `w = V²/V0²` and depth as the independent variable the equation of motion without viscosity is linear,
//!
//! ```text
//! dw/dx = -(a + b x + κ w),   a = 2p/(M V0²),  b = 2s/(M V0²),  κ = 2q/M,   w(0) = 1
//! ```
//!
//! and smooth through `w < 0`. Stage ends and the exit depth are then fixed stops, rest is a transversal root of w, and
//! the exit margin is w(exit) itself: nothing grazes where x(t) does (`docs/theory.md`, section 6). Each step sums the Taylor
//! series of w in x, whose coefficients follow from the equation, to as many terms as the tolerance needs; where
//! `q = 0` the series ends by itself. The stage's own formula, [`crate::physics::exit_energy::propagate`], is not used.
//!
//! The time `t̂ = V0 t` (m) comes after the depth and the speed at both ends of a stage are known. Its two forms
//!
//! ```text
//! dt̂/dx = w^(-1/2)                           singular at rest
//! dt̂/dv = -2/f,  dx/dv = -2v/f,  v = √w      regular at rest, singular at f = a + b x + κ v² = 0 (impact on a crater)
//! ```
//!
//! fail at opposite ends, and every step takes the one whose singularity is farther away, measured in what is left.
//!
//! A viscous stage (`r > 0`) brings √w into the first equation, which is then neither linear nor smooth at rest; it is
//! refused where no stage has a law of its own.
//!
//! A stage with a law of its own is solved by [`super::law_series`], whose steps go over depth, and over velocity near rest, and so is a
//! viscous one beside it. With `taylor` it shares the series of the expression, and not the variable.

use super::flight::{self, Bounded, Course, StageEnd, StageSolver};
use super::law_series::{LawSeries, Variable};
use super::outcome::{Cost, Detail, Flight, IntegrationError, Integrator, Margin, Solved, refuse_laws};
use crate::physics::{Law, Problem, Scalar, Stage, State};

/// Name of the method.
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

/// Bound on the steps of Newton's method for the place of a time; halving a bracket takes 53.
const INVERSE_STEPS_MAX: u32 = 64;

/// What to do where they do not suffice.
const REMEDY: &str = "take --method taylor";

/// Roundings that enter w in a step, in units of its terms: three in each coefficient and one for each sum.
const ROUNDINGS_PER_STEP: f64 = 4.0;

/// Integrates kinetic energy over depth. Exact to round-off unless a tolerance is asked for.
///
/// To be preferred where the outcome or the critical velocity matters: neither has a grazing case here. It is
/// independent of the time-domain methods, which makes it their cross-check.
///
/// Measured over 2,000 varied scenes against the closed form: depth 7e-16, V² 5e-16 of V0², times 3e-14 of their
/// condition number (1e-14 against the same code in double-double, the rest is the closed form's); the error of the
/// margin is at most 0.27 of its stated bound.
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
    pub fn with_rtol(rtol: f64) -> Solved<Self> {
        if rtol > 0.0 && rtol <= 0.01 {
            Ok(Self { rtol })
        } else {
            Err(IntegrationError::bad_option("rtol", &rtol, "a number above 0 and at most 0.01"))
        }
    }

    /// Relative tolerance of a step in the number type `S`.
    fn tolerance<S: Scalar>(self) -> f64 {
        self.rtol.max(S::EPSILON)
    }

    /// Integrates `problem` in any number type; dual numbers give the sensitivities of every result.
    ///
    /// Depth and margin are good to a few units of round-off of `S`; times likewise, each times its condition number.
    /// Of stages of coefficients only a trajectory allocates.
    ///
    /// # Errors
    /// - [`IntegrationError::Refused`]: a stage before the exit depth is viscous and none has a law of its own, or a law is one in code;
    /// - [`IntegrationError::NeverEnds`]: an unbounded last stage does not resist at rest;
    /// - [`IntegrationError::NotFinite`], [`IntegrationError::StepBudgetSpent`]: numbers beyond the range of `S`.
    pub fn solve_in<S: Scalar>(&self, problem: &Problem<S>, detail: Detail) -> Solved<Flight<S>> {
        if !problem.laws.is_empty() {
            return flight::solve(problem, detail, &mut Laws { tolerance: self.tolerance::<S>() });
        }
        refuse_viscosity(problem)?;
        let now = State { time: S::zero(), depth: S::zero(), velocity: S::one() };
        let mut stages = Stages { walk: Walk::from_impact(self.tolerance::<S>()), now, clock: Cost::default() };
        flight::solve(problem, detail, &mut stages)
    }

    /// The exit margin of `problem` alone: w is propagated to the exit, no root is sought and no time computed.
    ///
    /// The same number as [`Flight::exit_margin`], with its derivatives in a number type that has them. `None`
    /// without an exit depth, or at no impact speed.
    ///
    /// # Errors
    /// As [`Energy::solve_in`], save that a flight with an exit always ends here; [`IntegrationError::Refused`] for a problem with
    /// laws of its own, whose margin is that of the flight ([`Integrator::exit_margin`]).
    pub fn exit_margin_in<S: Scalar>(&self, problem: &Problem<S>) -> Solved<Option<(S, f64, Cost)>> {
        refuse_laws(problem, NAME)?;
        refuse_viscosity(problem)?;
        if !problem.has_exit() || problem.impact_speed.value() <= 0.0 {
            return Ok(None);
        }
        let mut walk = Walk::from_impact(self.tolerance::<S>());
        walk.reach_exit(problem, 0, |from| {
            let velocity = root_of(from.w).value() * problem.impact_speed.value();
            State { time: f64::NAN, depth: from.depth.value(), velocity }
        })?;
        Ok(Some((walk.least, walk.least_error, walk.cost)))
    }
}

impl Integrator for Energy {
    fn name(&self) -> &'static str {
        NAME
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        self.solve_in(problem, detail)
    }

    fn exit_margin(&self, problem: &Problem) -> Solved<Option<Margin>> {
        if !problem.laws.is_empty() {
            let flight = self.solve(problem, Detail::End)?;
            return Ok(flight.exit_margin.map(|value| Margin {
                value,
                error: flight.exit_margin_error,
                cost: flight.cost,
            }));
        }
        let margin = self.exit_margin_in(problem)?;
        Ok(margin.map(|(value, error, cost)| Margin { value, error: Some(error), cost }))
    }
}

/// Refuses a problem with viscosity before its exit.
fn refuse_viscosity<S: Scalar>(problem: &Problem<S>) -> Solved<()> {
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

/// `√w`, and zero, without the infinite derivative of the root, where w is not positive.
fn root_of<S: Scalar>(w: S) -> S {
    if w.value() > 0.0 { w.sqrt() } else { S::zero() }
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
    fn of(stage: &Stage<S>, problem: &Problem<S>, last: impl Fn() -> State) -> Solved<Self> {
        // Quotients throughout: neither 1/M nor the square of a speed may leave the range of the number type where the
        // result does not.
        let two = S::from_f64(2.0);
        let per_mass = |coefficient: S| two * coefficient.over(problem.mass);
        let relative = |force: S| per_mass(force).over(problem.impact_speed).over(problem.impact_speed);
        let loss = Self {
            steady: relative(stage.static_force),
            growing: relative(stage.stiffness),
            drag: per_mass(stage.drag),
        };
        if [loss.steady, loss.growing, loss.drag].iter().all(|c| c.value().is_finite()) {
            Ok(loss)
        } else {
            Err(IntegrationError::NotFinite { what: "force over M V0²", last: last() })
        }
    }

    /// `-dw/dx` at depth `x`; proportional to the force, with the same sign.
    fn rate(&self, x: S, w: S) -> S {
        self.steady + self.growing * x + self.drag * w
    }

    /// Whether w has come to its limit -a/κ, so that no distance however long changes it: behind a stop a target may be
    /// millions of drag lengths thick, and before one a driven projectile reaches its terminal velocity.
    fn is_at_limit(&self, x: S, w: S) -> bool {
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

    /// Distance within which the static force alone takes all of `w` (m); infinite where it never does.
    ///
    /// Rest is not farther than this, since drag only takes more.
    fn static_reach(&self, x: f64, w: f64) -> f64 {
        let (growing, here) = (self.growing.value(), self.steady.value() + self.growing.value() * x);
        if growing < 0.0 {
            // Exact, as there is no drag; none where the force falls to zero before.
            let left = here * here + 2.0 * growing * w;
            return if here > 0.0 && left >= 0.0 { 2.0 * w / (here + left.sqrt()) } else { f64::INFINITY };
        }
        let root = here.hypot((2.0 * growing * w).sqrt());
        if here >= 0.0 { 2.0 * w / (here + root) } else { (root - here) / growing }
    }
}

/// w over depth, on the path through the target.
#[derive(Clone, Copy, Debug)]
struct Walk<S> {
    depth: S,
    w: S,
    /// Error bound of w.
    error: f64,
    /// Least w at the stage ends passed so far, and the error bound it had there.
    least: S,
    least_error: f64,
    /// Relative tolerance of a step.
    tolerance: f64,
    cost: Cost,
}

impl<S: Scalar> Walk<S> {
    fn from_impact(tolerance: f64) -> Self {
        let (w, least) = (S::one(), S::from_f64(f64::INFINITY));
        Self { depth: S::zero(), w, error: 0.0, least, least_error: 0.0, tolerance, cost: Cost::default() }
    }

    /// Propagates w from the start of stage `first` to the exit. An error names the state that `last` makes of the walk
    /// at the start of its stage.
    fn reach_exit(&mut self, problem: &Problem<S>, first: usize, last: impl Fn(&Self) -> State) -> Solved<()> {
        for (index, stage) in problem.stages.iter().enumerate().skip(first) {
            let from = *self;
            let loss = Loss::of(stage, problem, || last(&from))?;
            self.cross(&loss, problem.limit_of(index), false, || last(&from))?;
            if stage.end.value() >= problem.exit_depth.value() {
                break;
            }
        }
        Ok(())
    }

    /// Notes w at a stage end if it is less than at those before.
    fn note_least(&mut self) {
        if self.w.value() < self.least.value() {
            (self.least, self.least_error) = (self.w, self.error);
        }
    }

    /// Propagates w to `limit`. Returns the depth of rest if `seek_rest` and w falls below zero before the limit.
    ///
    /// A finite limit is reached beyond rest, too; without one the path ends at rest. A w of exactly zero at the
    /// limit is an arrival, not a rest before it.
    fn cross(
        &mut self,
        loss: &Loss<S>,
        limit: S,
        seek_rest: bool,
        last_state: impl Fn() -> State,
    ) -> Solved<Option<S>> {
        let longest = DRAG_LENGTHS_MAX / loss.drag.value().abs();
        let mut rest = None;
        while self.depth.value() < limit.value() {
            if self.cost.steps >= STEPS_MAX {
                return Err(IntegrationError::StepBudgetSpent {
                    max_steps: STEPS_MAX,
                    remedy: REMEDY,
                    last: last_state(),
                });
            }
            let (x, w) = (self.depth, self.w);
            if limit.value().is_finite() && loss.is_at_limit(x, w) {
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
            // The step is the difference of two depths as they are stored: their rounding does not add up.
            let to = if last { limit } else { x + S::from_f64(length) };
            let h = to - x;
            if h.value() <= 0.0 && !limit.value().is_finite() {
                // Rest is nearer than depths can resolve; the quotient has its derivatives.
                rest = Some(x + w.over(loss.rate(x, w)));
                break;
            }

            // Every term of the sum, and every part of the rate, is at most of this size.
            let (a, b, drag) = (loss.steady.value().abs(), loss.growing.value().abs(), loss.drag.value());
            let size = w.value().abs() + h.value() * (a + b * to.value() + drag * w.value().abs());
            let negligible = 0.5 * self.tolerance * size;
            let (change, terms) = loss.change(x, w, h, negligible);
            self.w = w + change;
            self.depth = to;
            self.cost.steps += 1;
            self.cost.force_evaluations += u64::from(terms);
            // An error in w fades as w itself would without a static force.
            self.error = self.error * (-drag * h.value()).exp()
                + (self.tolerance.max(S::EPSILON) + ROUNDINGS_PER_STEP * S::EPSILON) * size;
            if !self.w.value().is_finite() || !self.error.is_finite() {
                return Err(IntegrationError::NotFinite { what: "V²", last: last_state() });
            }
            let falls = self.w.value() < 0.0 || (self.w.value() == 0.0 && !last);
            if seek_rest && rest.is_none() && falls {
                rest = Some(x + self.root(loss, x, w, h, negligible));
                if !limit.value().is_finite() {
                    break;
                }
            }
        }
        self.note_least();
        Ok(rest)
    }

    /// The distance in `(0, h]` from `x` at which w, positive at `x` and not beyond `h`, is zero.
    ///
    /// There is just one: once w falls it goes on falling. Newton's method, whose derivative is the equation itself,
    /// inside a bracket; its last step is taken in `S` and so has derivatives and low parts.
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
struct Clock<S> {
    loss: Loss<S>,
    tolerance: f64,
}

/// Depth (m), speed over V0, and `t̂ = V0 t` (m), in the fields of a state.
type Reduced<S> = State<S>;

/// A reduced state in SI units.
fn si<S: Scalar>(problem: &Problem<S>, now: Reduced<S>) -> State<S> {
    let unit = problem.impact_speed;
    State { time: now.time.over(unit), depth: now.depth, velocity: now.velocity * unit }
}

/// The method as the loop sees it.
struct Stages<S> {
    walk: Walk<S>,
    now: Reduced<S>,
    /// Work for the times.
    clock: Cost,
}

impl<S: Scalar> StageSolver<S> for Stages<S> {
    fn solve_stage(&mut self, course: &mut Course<'_, S>) -> Solved<StageEnd<S>> {
        let problem = course.problem;
        let here = course.state.values();
        let loss = Loss::of(&problem.stages[course.stage], problem, || here)?;
        let limit = course.limit()?;
        let rest = self.walk.cross(&loss, limit, true, || here)?;
        let (depth, velocity) = rest.map_or_else(|| (limit, root_of(self.walk.w)), |depth| (depth, S::zero()));
        let clock = Clock { loss, tolerance: self.walk.tolerance };
        self.now = clock.elapse(self.now, depth, velocity, &mut self.clock, course)?;
        (course.error_bound, course.cost) = (self.walk.error, self.walk.cost + self.clock);
        let end = si(problem, self.now);
        Ok(if rest.is_some() { StageEnd::Rest(end) } else { StageEnd::Limit(end) })
    }

    /// w itself, continued to the exit behind a stop.
    fn margin(&mut self, course: &mut Course<'_, S>) -> Solved<Bounded> {
        let (problem, last) = (course.problem, course.state.values());
        if !course.is_through && problem.stages[course.stage].end.value() < problem.exit_depth.value() {
            self.walk.reach_exit(problem, course.stage + 1, |_| last)?;
            course.cost = self.walk.cost + self.clock;
        }
        Ok(Bounded { value: self.walk.least.value(), bound: self.walk.least_error })
    }
}

/// The method where a stage has a law of its own.
struct Laws {
    tolerance: f64,
}

impl<S: Scalar> StageSolver<S> for Laws {
    #[cold]
    fn solve_stage(&mut self, course: &mut Course<'_, S>) -> Solved<StageEnd<S>> {
        let tolerance = self.tolerance;
        let stage = &course.problem.stages[course.stage];
        let viscous = course.law().is_none() && stage.viscosity.value() != 0.0;
        let viscous = viscous.then(|| Law::of_coefficients(stage));
        if let Some(law) = course.law().or(viscous.as_ref()) {
            let limit = course.limit()?;
            let series = LawSeries { method: NAME, variable: Variable::Depth, tolerance };
            return series.solve(course, law, limit);
        }
        // One of coefficients among them, from where the stages before it lead.
        let State { time, depth, velocity } = course.state;
        let unit = course.problem.impact_speed;
        let now = State { time: time * unit, depth, velocity: velocity.over(unit) };
        let w = now.velocity * now.velocity;
        let error = course.error_bound + ROUNDINGS_PER_STEP * S::EPSILON * w.value();
        let walk = Walk { depth, w, error, cost: course.cost, ..Walk::from_impact(tolerance) };
        Stages { walk, now, clock: Cost::default() }.solve_stage(course)
    }
}

impl<S: Scalar> Clock<S> {
    /// The state at depth `depth` and speed `velocity`, known beforehand, with the time it takes to get there.
    fn elapse(
        &self,
        from: Reduced<S>,
        depth: S,
        velocity: S,
        cost: &mut Cost,
        course: &mut Course<'_, S>,
    ) -> Solved<Reduced<S>> {
        let mut now = from;
        let end = State { depth, velocity, ..from };
        let end_rate = self.loss.rate(depth, velocity * velocity).value();
        for _ in 0..STEPS_MAX {
            let distance = (depth - now.depth).value();
            let fall = (now.velocity - velocity).value();
            if distance <= 0.0 && fall <= 0.0 {
                break;
            }
            let w = now.velocity * now.velocity;
            let rate = self.loss.rate(now.depth, w).value();
            let growing = self.loss.growing.value();
            // A force that falls with depth and drives may begin at a rounding above zero.
            let slows = rate > 0.0 && !(growing < 0.0 && rate + end_rate < 0.0);
            if slows && fall <= 0.0 {
                // The last speed is reached before the end by round-off alone: what is left is passed at it. Going on in
                // depth would close in on a rest that the walk does not have, without ever coming there.
                if velocity.value() > 0.0 {
                    now.time += (depth - now.depth).over(velocity);
                }
                break;
            }
            // Speed is a variable only where it is monotone down to the end. A force that slows goes on slowing;
            // one that drives does so to the end if it still does there.
            let monotone = (rate > 0.0 && fall > 0.0) || (rate < 0.0 && fall < 0.0 && end_rate < 0.0);
            let depth_radius = w.value() / rate.abs();
            // Where the force falls with depth, w may have its zeros beside the path: as far away as this.
            let depth_radius =
                if growing < 0.0 { depth_radius.min((-2.0 * w.value() / growing).sqrt()) } else { depth_radius };
            let v = now.velocity.value();
            let rate_slope = 2.0 * v * (self.loss.drag.value() - self.loss.growing.value() / rate);
            let speed_radius = (rate / rate_slope).abs();
            // Nor where it hardly changes: the fall is a difference, and its lost digits would be those of the time.
            let falls_much = fall.abs() > LEAST_FALL * v;
            let by_speed =
                monotone && (distance <= 0.0 || (falls_much && speed_radius / fall.abs() > depth_radius / distance));
            let done = if by_speed {
                self.step_in_speed(&mut now, end, speed_radius, course)
            } else if distance > 0.0 {
                self.step_in_depth(&mut now, end, depth_radius, course)
            } else {
                break;
            };
            cost.steps += 1;
            cost.force_evaluations += TIME_ORDER as u64;
            if !now.time.value().is_finite() || !now.velocity.value().is_finite() {
                let last = si(course.problem, from).values();
                return Err(IntegrationError::NotFinite { what: "time or speed", last });
            }
            if done {
                break;
            }
            if now.velocity.value() <= 0.0 {
                // Series and walk differ by round-off: rest is reached, and the end with it.
                break;
            }
            course.sample(si(course.problem, now));
            if cost.steps >= STEPS_MAX {
                let last = si(course.problem, now).values();
                return Err(IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, remedy: REMEDY, last });
            }
        }
        Ok(State { time: now.time, depth, velocity })
    }

    /// One step of `dt̂/dx = w^(-1/2)`; says whether it reached the place of `end`.
    fn step_in_depth(&self, now: &mut Reduced<S>, end: Reduced<S>, radius: f64, course: &mut Course<'_, S>) -> bool {
        let left = end.depth - now.depth;
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
                sum += S::from_f64(n as f64 - 0.5 * k as f64) * w[k] * slowness[n - k];
            }
            slowness[n] = -sum.over(S::from_f64(n as f64) * w0);
        }
        let (length, done) = self.step_length(&slowness, left.over(unit));
        let from = *now;
        let time = now.time + unit * integral(&slowness, length);
        let inside = State { time, depth: now.depth + unit * length, velocity: root_of(value(&w, length)) };
        *now = if done { State { time, ..end } } else { inside };
        sample_inside(course, from, *now, unit, &slowness, length, |z| (from.depth + unit * z, root_of(value(&w, z))));
        done
    }

    /// One step of `dt̂/dv = -2/f, dx/dv = -2v/f`; says whether it reached the speed of `end`.
    fn step_in_speed(&self, now: &mut Reduced<S>, end: Reduced<S>, radius: f64, course: &mut Course<'_, S>) -> bool {
        let fall = now.velocity - end.velocity;
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
        let from = *now;
        let time = now.time + unit * integral(&inverse, length);
        let inside = State { time, depth: now.depth + value(&gain, length), velocity: v - unit * length };
        *now = if done { State { time, ..end } } else { inside };
        sample_inside(course, from, *now, unit, &inverse, length, |z| (from.depth + value(&gain, z), v - unit * z));
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

/// Adds the states at the times asked for within a step `from` `to`, whose variable z, in units of `unit`, goes up to
/// `length`: `slowness` is the series of dt̂/dz, and `at` gives depth and speed.
fn sample_inside<S: Scalar>(
    course: &mut Course<'_, S>,
    from: Reduced<S>,
    to: Reduced<S>,
    unit: S,
    slowness: &[S; TIME_ORDER],
    length: S,
    at: impl Fn(S) -> (S, S),
) {
    let problem = course.problem;
    course.sample_until(si(problem, to), |time| {
        let goal = (S::from_f64(time) * problem.impact_speed - from.time).over(unit);
        // Time rises with z: Newton's method inside a bracket.
        let (mut low, mut high) = (0.0, length.value());
        let mut z = goal.over(slowness[0]);
        for _ in 0..INVERSE_STEPS_MAX {
            if !(low..=high).contains(&z.value()) {
                z = S::from_f64(0.5 * (low + high));
            }
            let late = integral(slowness, z) - goal;
            // Both fall where a drive makes the unit of speed negative.
            let is_late = late.value() * slowness[0].value() > 0.0;
            *if is_late { &mut high } else { &mut low } = z.value();
            let step = late.over(value(slowness, z));
            z -= step;
            if step.value().abs() <= S::EPSILON * z.value().abs() {
                break;
            }
        }
        let (depth, velocity) = at(z);
        si(problem, State { time: from.time, depth, velocity })
    });
}

/// `Σ c_n z^n`.
fn value<S: Scalar>(series: &[S], z: S) -> S {
    series.iter().rev().fold(S::zero(), |sum, &c| sum * z + c)
}

/// `Σ c_n z^(n+1)/(n+1)`.
fn integral<S: Scalar>(series: &[S], z: S) -> S {
    let mean = |sum: S, (n, &c): (usize, &S)| sum * z + c.over(S::from_f64((n + 1) as f64));
    series.iter().enumerate().rev().fold(S::zero(), mean) * z
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a failed unwrap is a failed test")]
mod tests;
