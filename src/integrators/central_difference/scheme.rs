//! Equations 6 to 8, step by step: the force rule, the sums, the clock, and the loop over whole steps.

use super::stability::{automatic_step, stability_limit};
use super::{CentralDifference, Steps, Summation, VelocityAt};
use crate::integrators::outcome::{Cost, IntegrationError, Solved, StepLimit};
use crate::physics::{Law, Problem, Scalar, Stage, State};

/// What to do where the steps allowed do not suffice.
pub(super) const REMEDY: &str = "take a longer --dt, or --method taylor";

impl VelocityAt {
    /// Evaluations of the force in one step.
    pub(super) fn evaluations(self) -> u64 {
        if self == Self::PredictedHalfStep { 2 } else { 1 }
    }

    /// Deceleration F/M at depth `x`, from the velocity `u` half a step `half` before.
    #[inline(always)]
    pub(super) fn deceleration<S: Scalar>(self, law: &impl Deceleration<S>, x: S, u: S, half: S) -> S {
        match self {
            Self::LaggedHalfStep => law.at(x, u),
            Self::Centred => law.at(x, law.centred(x, u, half)),
            Self::PredictedHalfStep => law.predicted(x, u, half),
        }
    }
}

/// The deceleration F/M of a stage, as the scheme asks it.
pub(super) trait Deceleration<S> {
    /// Whether V may fall and rise again inside a stage.
    const MAY_RISE: bool;

    /// F/M at depth `x` and velocity `v`, which may lie below zero in the step that comes to rest.
    fn at(&self, x: S, v: S) -> S;

    /// Whether a condition ends the stage at depth `x` and velocity `v`.
    #[inline(always)]
    fn ends(&self, _x: S, _v: S) -> bool {
        false
    }

    /// The stage about a state, per unit mass: its stiffness, and a drag or a viscosity with the slope of the force over V there.
    fn linear(&self, x: S, v: S) -> Stage;

    /// The solution V of `V = u - half F(x, V)/M`.
    fn centred(&self, x: S, u: S, half: S) -> S;

    /// F/M at `V = u - half F(x, u)/M`.
    #[inline(always)]
    fn predicted(&self, x: S, u: S, half: S) -> S
    where
        S: Scalar,
    {
        self.at(x, u - half * self.at(x, u))
    }
}

/// The stage per unit mass.
impl<S: Scalar> Deceleration<S> for Stage<S> {
    const MAY_RISE: bool = false;

    #[inline(always)]
    fn at(&self, x: S, v: S) -> S {
        self.force(x, v)
    }

    fn linear(&self, _x: S, _v: S) -> Stage {
        self.values()
    }

    #[inline(always)]
    fn centred(&self, x: S, u: S, half: S) -> S {
        // half q V² + (1 + half r) V = u - half (p + s x), in the form that does not cancel for small drag.
        let known = u - half * (self.static_force + self.stiffness * x);
        let linear = S::one() + half * self.viscosity;
        let discriminant = linear * linear + S::from_f64(4.0) * half * self.drag * known;
        // Without a real root the step goes far past rest; the vertex of the parabola is the least V there is.
        let root = if discriminant.value() > 0.0 { discriminant.sqrt() } else { S::zero() };
        (S::from_f64(2.0) * known).over(linear + root)
    }
}

/// Corrections of a velocity: by Newton four are usual, and halvings exhaust the digits of a number.
const CORRECTIONS_MAX: u32 = 80;

/// A law of its own, the mass, and the sign of the condition of its stage before its end.
impl<S: Scalar> Deceleration<S> for (&Law<S>, S, f64) {
    const MAY_RISE: bool = true;

    fn ends(&self, x: S, v: S) -> bool {
        self.0.end().is_some_and(|end| self.2 * end.value(x.value(), v.value()) <= 0.0)
    }

    fn at(&self, x: S, v: S) -> S {
        let force = self.0.force(x, v);
        // Below zero a power of V has no value; the step that comes to rest then ends with the force at rest.
        let force = if force.value().is_nan() && v.value() < 0.0 { self.0.force(x, S::zero()) } else { force };
        force.over(self.1)
    }

    fn linear(&self, x: S, v: S) -> Stage {
        let mass = self.1.value();
        let (by_depth, by_velocity) = self.0.slopes(x.value(), v.value());
        Stage { stiffness: by_depth / mass, viscosity: by_velocity / mass, ..Stage::free() }
    }

    /// As the root between rest and u, if it lies there; the force at rest does what is beyond.
    fn centred(&self, x: S, u: S, half: S) -> S {
        let lacking = |v: S| v + half * self.at(x, v) - u;
        if u.value() <= 0.0 || lacking(S::zero()).value() >= 0.0 {
            return u - half * self.at(x, S::zero());
        }
        let (mut low, mut high, mut v) = (0.0, u.value(), u - half * self.at(x, u));
        for _ in 0..CORRECTIONS_MAX {
            if !(v.value() > low && v.value() < high) {
                v = S::from_f64(0.5 * (low + high));
            }
            let lack = lacking(v);
            if lack.value() < 0.0 {
                low = v.value();
            } else {
                high = v.value();
            }
            let by_velocity = self.0.slope_over_velocity(x.value(), v.value());
            let correction = lack.over(S::one() + half * S::from_f64(by_velocity / self.1.value()));
            v -= correction;
            if !(correction.value().abs() > 4.0 * S::EPSILON * v.value().abs()) || high <= low.next_up() {
                break;
            }
        }
        v
    }

    fn predicted(&self, x: S, u: S, half: S) -> S {
        let lagged = self.at(x, u);
        let v = u - half * lagged;
        // Where the half step ahead goes past rest and the law has no value there, the lagged force ends the step.
        if v.value() < 0.0 && self.0.force(x, v).value().is_nan() { lagged } else { self.at(x, v) }
    }
}

/// Of a stage or a law.
#[derive(Clone, Copy)]
pub(super) enum Rule<'a, S> {
    Stage(Stage<S>),
    Law(&'a Law<S>, S, f64),
}

impl<'a, S: Scalar> Rule<'a, S> {
    /// That of stage `index`, entered at a state, where `mass` moves.
    fn of(problem: &'a Problem<S>, index: usize, mass: S, at: State<S>) -> Self {
        match problem.laws.of(index) {
            None => Self::Stage(problem.stages[index].per_mass(mass)),
            Some(law) => Self::Law(law, mass, law.end().map_or(1.0, |end| end.side(at))),
        }
    }
}

impl<S: Scalar> Deceleration<S> for Rule<'_, S> {
    const MAY_RISE: bool = true;

    #[inline(always)]
    fn at(&self, x: S, v: S) -> S {
        match self {
            Self::Stage(stage) => stage.at(x, v),
            Self::Law(law, mass, side) => (*law, *mass, *side).at(x, v),
        }
    }

    fn linear(&self, x: S, v: S) -> Stage {
        match self {
            Self::Stage(stage) => stage.linear(x, v),
            Self::Law(law, mass, side) => (*law, *mass, *side).linear(x, v),
        }
    }

    #[inline(always)]
    fn centred(&self, x: S, u: S, half: S) -> S {
        match self {
            Self::Stage(stage) => stage.centred(x, u, half),
            Self::Law(law, mass, side) => (*law, *mass, *side).centred(x, u, half),
        }
    }

    #[inline(always)]
    fn predicted(&self, x: S, u: S, half: S) -> S {
        match self {
            Self::Stage(stage) => stage.predicted(x, u, half),
            Self::Law(law, mass, side) => (*law, *mass, *side).predicted(x, u, half),
        }
    }
}

/// A number that increments are added to.
#[derive(Clone, Copy)]
pub(super) struct Sum<S> {
    pub(super) value: S,
    /// What the last addition rounded off, where [`Summation::Compensated`] keeps it.
    lost: S,
}

impl<S: Scalar> Sum<S> {
    pub(super) fn new(value: S) -> Self {
        Self { value, lost: S::zero() }
    }

    #[inline(always)]
    pub(super) fn plus(self, increment: S, summation: Summation) -> Self {
        match summation {
            Summation::Plain => Self { value: self.value + increment, ..self },
            Summation::Compensated => {
                let increment = increment + self.lost;
                let value = self.value + increment;
                Self { value, lost: increment - (value - self.value) }
            }
        }
    }
}

/// The size of the step ahead, and the time that the steps behind add up to.
#[derive(Clone, Copy)]
pub(super) enum Clock<'a, S> {
    /// Whole steps of `size` (s) since the impact or the last landing, at time `since`.
    Equal { size: S, since: S, count: u64 },
    /// [`Steps::Given`]: the index of the next size, and the sum of those before.
    Given { sizes: &'a [f64], next: usize, time: Sum<S> },
    /// [`Steps::Automatic`]: the factor, the last step, and the sum of those before.
    Automatic { safety: f64, step: S, time: Sum<S> },
}

impl<S: Scalar> Clock<'_, S> {
    /// Size of the next step (s).
    #[inline(always)]
    pub(super) fn step(&self) -> S {
        match *self {
            Self::Equal { size, .. } => size,
            Self::Given { sizes, next, .. } => S::from_f64(sizes[next]),
            Self::Automatic { step, .. } => step,
        }
    }

    /// Time since impact (s).
    pub(super) fn now(&self) -> S {
        match *self {
            Self::Equal { size, since, count } => since + S::from_f64(count as f64) * size,
            Self::Given { time, .. } | Self::Automatic { time, .. } => time.value,
        }
    }

    /// Chooses the step ahead from a node of a stage, whose coefficients are per unit mass.
    #[inline(always)]
    fn adapt(&mut self, law: &impl Deceleration<S>, node: &Node<S>) {
        if let Self::Automatic { safety, step, .. } = self
            && let Some(longest) = automatic_step(&law.linear(node.x.value, node.v), 1.0, node.v.value())
        {
            *step = S::from_f64(*safety * longest);
        }
    }

    /// A whole step was taken.
    #[inline(always)]
    pub(super) fn tick(&mut self) {
        match self {
            Self::Equal { count, .. } => *count += 1,
            Self::Given { .. } | Self::Automatic { .. } => self.tick_part(self.step()),
        }
    }

    /// A step was shortened to `part` (s).
    pub(super) fn tick_part(&mut self, part: S) {
        let now = self.now();
        match self {
            Self::Equal { since, count, .. } => (*since, *count) = (now + part, 0),
            Self::Given { sizes, next, time } => {
                *time = time.plus(part, Summation::Compensated);
                *next = if *next + 1 == sizes.len() { 0 } else { *next + 1 };
            }
            Self::Automatic { time, .. } => *time = time.plus(part, Summation::Compensated),
        }
    }
}

/// State of the scheme between two steps.
#[derive(Clone, Copy)]
pub(super) struct Node<S> {
    /// x(i).
    pub(super) x: Sum<S>,
    /// V(i-1/2).
    pub(super) u: Sum<S>,
    /// V(i).
    pub(super) v: S,
    /// Deceleration -a(i).
    pub(super) d: S,
    /// dt(i).
    pub(super) h: S,
}

impl<S: Scalar> Node<S> {
    /// The node at a state known by its velocity: `V(i-1/2) = V(i) - dt/2 a(i)`, so that Eq. 6 continues from it.
    fn start(law: &impl Deceleration<S>, state: State<S>, h: S) -> Self {
        let d = law.at(state.depth, state.velocity);
        let u = Sum::new(state.velocity + S::from_f64(0.5) * h * d);
        Self { x: Sum::new(state.depth), u, v: state.velocity, d, h }
    }

    /// The node reached with V(i+1/2) = `u` at depth `x` by a step of size `h`.
    #[inline(always)]
    fn reached(velocity: VelocityAt, law: &impl Deceleration<S>, x: Sum<S>, u: Sum<S>, h: S) -> Self {
        let half = S::from_f64(0.5) * h;
        let d = velocity.deceleration(law, x.value, u.value, half);
        Self { x, u, v: u.value - half * d, d, h }
    }

    /// x(i+1) and V(i+1/2) of a step of size `h` by Eq. 6 and 7.
    #[inline(always)]
    pub(super) fn ahead(&self, h: S, summation: Summation) -> (Sum<S>, Sum<S>) {
        let u = self.u.plus(-(S::from_f64(0.5) * (self.h + h) * self.d), summation);
        (self.x.plus(h * u.value, summation), u)
    }
}

/// Why [`Stepper::cruise`] stopped before a step.
pub(super) enum Pause<S> {
    /// It took as many steps as it was allowed.
    Allowance,
    /// The next step, with V(i+1/2) = `u`, reaches the limit at x(i+1) = `x` (or x is NaN). Its force is not
    /// evaluated: the boundary rule decides in which stage.
    Crossing { x: Sum<S>, u: Sum<S> },
    /// The next step comes to rest (or V is NaN) before the limit.
    Rest(Node<S>),
    /// The next step ends where the condition of the stage is met, moving and before the limit.
    Condition(Node<S>),
}

/// The scheme at one node of a problem.
pub(super) struct Stepper<'a, S> {
    pub(super) options: &'a CentralDifference,
    pub(super) problem: &'a Problem<S>,
    pub(super) clock: Clock<'a, S>,
    /// Stage that gives the force at the node, and its force rule divided by the mass.
    pub(super) stage: usize,
    /// The mass (kg) that moves.
    pub(super) mass: S,
    pub(super) law: Rule<'a, S>,
    pub(super) node: Node<S>,
    pub(super) cost: Cost,
    /// Largest V(i) and dt in this stage.
    speed_max: f64,
    pub(super) step_max: f64,
    /// Least V(i) in stages in which V may rise again.
    pub(super) speed_min: f64,
    pub(super) step_limit: StepLimit,
}

impl<'a, S: Scalar> Stepper<'a, S> {
    /// The scheme at impact, behind every stage end at the face.
    pub(super) fn new(options: &'a CentralDifference, problem: &'a Problem<S>) -> Self {
        let impact = State::at_impact(problem);
        let clock = match &options.steps {
            Steps::Given(sizes) => Clock::Given { sizes, next: 0, time: Sum::new(S::zero()) },
            Steps::Automatic(safety) => {
                let step = S::from_f64(options.time_step(problem));
                Clock::Automatic { safety: *safety, step, time: Sum::new(S::zero()) }
            }
            _ => Clock::Equal { size: S::from_f64(options.time_step(problem)), since: S::zero(), count: 0 },
        };
        let stage = stage_at(problem, 0, impact.depth);
        let law = Rule::of(problem, stage, problem.mass, impact);
        Self {
            options,
            problem,
            clock,
            stage,
            mass: problem.mass,
            law,
            node: Node::start(&law, impact, clock.step()),
            cost: Cost { force_evaluations: 1, ..Cost::default() },
            speed_max: 0.0,
            step_max: 0.0,
            speed_min: f64::INFINITY,
            step_limit: StepLimit { limit: f64::INFINITY, stable: true },
        }
    }

    /// Starts afresh at a state known by its velocity.
    pub(super) fn start(&mut self, state: State<S>) {
        self.node = Node::start(&self.law, state, self.clock.step());
        self.cost.force_evaluations += 1;
    }

    pub(super) fn state(&self) -> State<S> {
        State { time: self.clock.now(), depth: self.node.x.value, velocity: self.node.v }
    }

    /// Enters the stage whose force holds at depth `x`.
    pub(super) fn enter_stage_at(&mut self, x: S) {
        let stage = stage_at(self.problem, self.stage, x);
        if stage != self.stage {
            self.judge_steps();
            self.stage = stage;
            self.law = Rule::of(self.problem, stage, self.mass, State { depth: x, ..self.state() });
        }
    }

    /// Enters `stage` at a state with `mass` moving, and starts afresh.
    pub(super) fn enter(&mut self, stage: usize, mass: S, state: State<S>) {
        self.judge_steps();
        (self.stage, self.mass) = (stage, mass);
        self.law = Rule::of(self.problem, stage, mass, state);
        self.start(state);
    }

    /// Compares the longest step since the last call with the stability limit at the greatest speed since. Called where a
    /// stage ends, and behind each step of a clock that changes its steps.
    pub(super) fn judge_steps(&mut self) {
        if self.step_max > 0.0 {
            let at = State { velocity: S::from_f64(self.speed_max), ..self.state() };
            let law = &self.problem.linear(self.stage, at);
            let limit = stability_limit(law, self.mass.value(), self.speed_max, self.options.velocity);
            self.step_limit.limit = self.step_limit.limit.min(limit);
            self.step_limit.stable &= self.step_max < limit;
        }
        self.speed_max = 0.0;
        self.step_max = 0.0;
    }

    /// Takes whole steps inside one stage up to the next event, `limit` (m) or `allowance`.
    pub(super) fn cruise(&mut self, limit: f64, allowance: u64) -> Pause<S> {
        use VelocityAt::{Centred, LaggedHalfStep, PredictedHalfStep};
        let CentralDifference { velocity, summation, .. } = *self.options;
        let law = match self.law {
            Rule::Stage(stage) => stage,
            Rule::Law(law, mass, side) => {
                return self.whole_steps(&(law, mass, side), velocity, summation, self.clock, limit, allowance);
            }
        };
        if let (Summation::Plain, Clock::Equal { size, since, count }) = (summation, self.clock) {
            // Choices written as literals leave no branch in the loop: a third of its time.
            let clock = Clock::Equal { size, since, count };
            return match velocity {
                LaggedHalfStep => self.whole_steps(&law, LaggedHalfStep, Summation::Plain, clock, limit, allowance),
                Centred => self.whole_steps(&law, Centred, Summation::Plain, clock, limit, allowance),
                PredictedHalfStep => {
                    self.whole_steps(&law, PredictedHalfStep, Summation::Plain, clock, limit, allowance)
                }
            };
        }
        self.whole_steps(&law, velocity, summation, self.clock, limit, allowance)
    }

    #[inline(always)]
    fn whole_steps<D: Deceleration<S>>(
        &mut self,
        law: &D,
        velocity: VelocityAt,
        summation: Summation,
        mut clock: Clock<'a, S>,
        limit: f64,
        allowance: u64,
    ) -> Pause<S> {
        let mut here = self.node;
        let mut taken = 0;
        let mut speed_max = here.v.value();
        let mut step_max: f64 = 0.0;
        let pause = loop {
            if taken == allowance {
                break Pause::Allowance;
            }
            clock.adapt(law, &here);
            let h = clock.step();
            let (x, u) = here.ahead(h, summation);
            // Both tests are written so that NaN leaves the loop.
            let inside = x.value.value() < limit;
            if !inside {
                break Pause::Crossing { x, u };
            }
            step_max = step_max.max(h.value());
            let next = Node::reached(velocity, law, x, u, h);
            let moving = next.v.value() > 0.0;
            if !moving {
                break Pause::Rest(next);
            }
            if law.ends(next.x.value, next.v) {
                break Pause::Condition(next);
            }
            here = next;
            if !matches!(clock, Clock::Equal { .. }) {
                (self.node, self.speed_max, self.step_max) = (here, speed_max, step_max);
                self.judge_steps();
                (speed_max, step_max) = (0.0, 0.0);
            }
            clock.tick();
            taken += 1;
            speed_max = speed_max.max(here.v.value());
            if D::MAY_RISE {
                self.speed_min = self.speed_min.min(here.v.value());
            }
        };
        self.node = here;
        self.clock = clock;
        self.cost.steps += taken;
        self.cost.force_evaluations += taken * velocity.evaluations();
        self.speed_max = self.speed_max.max(speed_max);
        self.step_max = self.step_max.max(step_max);
        pause
    }

    /// [`Node::reached`] with the force of the present stage.
    pub(super) fn arrive(&mut self, x: Sum<S>, u: Sum<S>, h: S) -> Node<S> {
        self.cost.force_evaluations += self.options.velocity.evaluations();
        Node::reached(self.options.velocity, &self.law, x, u, h)
    }

    /// A step of size `h`, without any event. The caller advances the clock.
    fn advance(&mut self, h: S) {
        let (x, u) = self.node.ahead(h, self.options.summation);
        self.node = self.arrive(x, u, h);
    }

    /// [`CentralDifference::free_states`].
    pub(super) fn free(mut self, count: usize) -> Vec<State<S>> {
        let next = |_| {
            let state = self.state();
            self.advance(self.clock.step());
            self.clock.tick();
            state
        };
        (0..count).map(next).collect()
    }

    /// [`CentralDifference::forced_states`].
    pub(super) fn forced(mut self, source: impl Fn(usize, S) -> S, ends: &[f64]) -> Solved<Vec<State<S>>> {
        let problem = self.problem;
        let mut states = vec![self.state()];
        for (stage, &end) in ends.iter().enumerate() {
            let law = problem.stages[stage].per_mass(problem.mass);
            // At a given time the outer force is one more static force, whatever the velocity rule makes of the rest.
            let law_at =
                |time| Stage { static_force: law.static_force - source(stage, time).over(problem.mass), ..law };
            let start = self.state();
            self.law = Rule::Stage(law_at(start.time));
            self.start(start);
            let mut lands = false;
            while !lands {
                if states.len() as u64 > self.options.max_steps {
                    let (max_steps, last) = (self.options.max_steps, self.state().values());
                    return Err(IntegrationError::StepBudgetSpent { max_steps, remedy: REMEDY, last });
                }
                let (now, h) = (self.clock.now(), self.clock.step());
                let left = S::from_f64(end) - now;
                lands = left.value() <= h.value();
                let h = if lands { left } else { h };
                self.law = Rule::Stage(law_at(now + h));
                self.advance(h);
                if lands {
                    self.clock.tick_part(h);
                } else {
                    self.clock.tick();
                }
                states.push(self.state());
            }
        }
        Ok(states)
    }
}

/// Index of the stage whose force holds at depth `x`, not before `from`: beyond every end at or before `x`.
///
/// An end at the exit depth, or past it, changes nothing: the projectile does not get there.
pub(super) fn stage_at<S: Scalar>(problem: &Problem<S>, from: usize, x: S) -> usize {
    let is_behind = |end: f64| end <= x.value() && end < problem.exit_depth.value();
    from + problem.stages[from..].iter().take_while(|stage| is_behind(stage.end.value())).count()
}
