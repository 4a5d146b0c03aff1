//! The one loop over the stages of a flight. What does a method have to solve, and what follows from its answers?
//!
//! A method solves one stage, from a state at its start to its limit: the stage's end or the exit depth, whichever
//! comes first. It answers [`StageEnd`]: the limit is reached, the projectile comes to rest before it, or it approaches
//! a place for ever. Everything else is decided here, once for all methods: which stage is next, which events happen at
//! a place and in which order, whether the flight ends, the exit margin and its error bound, the outcome.
//!
//! Of the law of a stage the loop asks the force for the trajectory, whether it ever stops the projectile, and the
//! energy or speed that is missing behind a stop ([`crate::physics::exit_energy`]).

use std::cmp::Ordering;

use super::outcome::{Cost, Detail, Events, Flight, IntegrationError, Sample, Solved};
use crate::physics::exit_energy::{energy_beyond_stop_of, speed_missing};
pub(crate) use crate::physics::problem::StageEnd;
use crate::physics::{Condition, Event, EventKind, Law, Outcome, Problem, Scalar, Stage, State, Target};

/// What is said of a place that is reached without speed, if it is reached.
const LEAST_TIME: &str = "the speed vanishes towards the end: the time is the least possible, until 2e-16 of the speed is \
                          left, and may be infinite";

/// Velocity over the impact speed below which a force that vanishes with it is taken for its power.
pub(crate) const SLOW: f64 = 1e-6;

/// Velocity over the impact speed below which what is left of a flight goes by the power of V with which the force vanishes.
pub(crate) const VANISHING: f64 = 1e-12;

/// The rest of a projectile `at` a state with this `deceleration` (m/s²) where the force vanishes as `F = a V^n`, n < 1: M V/((1 - n) F)
/// later and M V²/((2 - n) F) deeper.
pub(crate) fn rest_by_power<S: Scalar>(at: State<S>, deceleration: S, power: f64) -> State<S> {
    let over = |exponent: f64| S::one().over(S::from_f64(exponent - power) * deceleration);
    State {
        time: at.time + at.velocity * over(1.0),
        depth: at.depth + at.velocity * at.velocity * over(2.0),
        velocity: S::zero(),
    }
}

/// Why a law of its own brings nothing to rest.
pub(crate) const VANISHES: &str = "its resistance vanishes with the velocity, so that it is only slowed for ever";

/// Why nothing ends a stage that drives.
pub(crate) const DRIVES: &str = "the last stage drives the projectile and has no far side";

/// Why a table of velocity brings nothing to rest.
const TERMINAL: &str =
    "the force of its table vanishes at a speed that it approaches for ever, and there is no far side";

/// A method, as the loop sees it.
pub(crate) trait StageSolver<S: Scalar> {
    /// Solves stage `course.stage` from `course.state` (V > 0, before the limit) to [`Course::limit`].
    ///
    /// Adds its work to `course.cost` and the error of `W/V0²` to `course.error_bound`.
    ///
    /// # Errors
    /// [`IntegrationError`]: the stage is refused, a budget is spent, or a number is not finite.
    fn solve_stage(&mut self, course: &mut Course<'_, S>) -> Solved<StageEnd<S>>;

    /// Whether `condition` is met in a state in which its stage begins.
    fn meets(&mut self, condition: &Condition<S>, at: State<S>) -> bool {
        condition.is_met(at)
    }

    /// Exit margin of the finished flight with its error bound.
    ///
    /// # Errors
    /// As [`StageSolver::solve_stage`], for a method that integrates beyond a stop.
    #[inline(always)]
    fn margin(&mut self, course: &mut Course<'_, S>) -> Solved<Bounded> {
        Ok(course.margin())
    }
}

/// A value and the bound of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounded {
    pub(crate) value: f64,
    pub(crate) bound: f64,
}

impl Bounded {
    /// No value yet: greater than all.
    pub(crate) const NONE: Self = Self { value: f64::INFINITY, bound: 0.0 };

    /// The lesser of the two. The error bound of the greater counts as far as it reaches below that of the lesser.
    pub(crate) fn min(self, other: Self) -> Self {
        let (lesser, greater) = if self.value <= other.value { (self, other) } else { (other, self) };
        let reaching = greater.bound - (greater.value - lesser.value);
        Self { bound: if reaching > lesser.bound { reaching } else { lesser.bound }, ..lesser }
    }

    /// Whether the sign of the value is certain. That of NaN is not.
    pub(crate) fn is_decided(self) -> bool {
        self.value.abs().partial_cmp(&self.bound) == Some(Ordering::Greater)
    }
}

/// A flight in progress.
pub(crate) struct Course<'a, S = f64> {
    pub(crate) problem: &'a Problem<S>,
    /// Its stages, as a slice: the list is asked anew at each use where they lie.
    pub(crate) stages: &'a [Stage<S>],
    pub(crate) detail: Detail<'a>,
    /// State at the start of the present stage; at the end of the flight, its end.
    pub(crate) state: State<S>,
    /// The mass (kg) that moves.
    pub(crate) mass: S,
    /// Index of the present stage.
    pub(crate) stage: usize,
    /// Whether the exit depth is reached.
    pub(crate) is_through: bool,
    pub(crate) cost: Cost,
    /// Error bound of `W/V0²` at `state`.
    pub(crate) error_bound: f64,
    /// Whether the error bound leaves open if a stage ends on its condition.
    pub(crate) is_in_doubt: bool,
    /// What the method reports about its choices.
    pub(crate) notes: Vec<String>,
    events: Events<S>,
    trajectory: Vec<Sample>,
    /// How many of the times asked for are passed.
    passed: usize,
    /// Least `W/V0²` passed so far: at stage ends, or where a law of its own lets V rise again.
    least_at_ends: Bounded,
    /// The stage that ended on its condition in the present state.
    just_met: Option<usize>,
    /// In a stage whose force is a table of velocity, the law of the piece on which the projectile is.
    piece: Option<&'a Law<S>>,
}

impl<'a, S: Scalar> Course<'a, S> {
    /// A flight at impact.
    #[inline(always)]
    pub(crate) fn new(problem: &'a Problem<S>, detail: Detail<'a>) -> Self {
        Self {
            problem,
            stages: &problem.stages,
            detail,
            state: State::at_impact(problem),
            mass: problem.mass,
            stage: 0,
            is_through: false,
            cost: Cost::default(),
            error_bound: 0.0,
            is_in_doubt: false,
            notes: Vec::new(),
            events: Events::new(),
            trajectory: Vec::new(),
            passed: 0,
            least_at_ends: Bounded::NONE,
            just_met: None,
            piece: None,
        }
    }

    /// The law of its own that a method has to solve: that of the present stage, of a table of velocity that of the piece.
    #[inline(always)]
    pub(crate) fn law(&self) -> Option<&'a Law<S>> {
        match self.piece {
            None => self.problem.laws.of(self.stage),
            piece => piece,
        }
    }

    /// Where the solution through the present stage ends (m); infinite where only rest can end it.
    ///
    /// # Errors
    /// [`IntegrationError::NeverEnds`] where nothing can.
    #[inline(always)]
    pub(crate) fn limit(&self) -> Solved<S> {
        let stage = &self.stages[self.stage];
        let limit = self.problem.limit_in(stage);
        // A static force that is positive far out brings every projectile to rest.
        let stops_far_out = |law: &Stage<S>| {
            law.stiffness.value() > 0.0 || (law.static_force.value() > 0.0 && law.stiffness.value() == 0.0)
        };
        let is_open = limit.value() == f64::INFINITY && !stops_far_out(stage);
        if is_open { self.limitless() } else { Ok(limit) }
    }

    /// No limit, where the force of the stage is an expression: the flight shows whether it ends.
    ///
    /// # Errors
    /// [`IntegrationError::NeverEnds`] for coefficients that stop nothing.
    #[cold]
    fn limitless(&self) -> Solved<S> {
        self.refuse_unknown_force()?;
        let law = &self.stages[self.stage];
        if let Some(own) = self.problem.laws.of(self.stage) {
            let last = self.state.values();
            if own.end().is_none() && own.table().is_some_and(|table| table.terminal(last.velocity).is_some()) {
                return Err(IntegrationError::NeverEnds { why: TERMINAL, last });
            }
            if own.end().is_none() && own.never_slows(last.depth) {
                return Err(IntegrationError::NeverEnds { why: DRIVES, last });
            }
            return Ok(S::from_f64(f64::INFINITY));
        }
        let why = if law.static_force.value() < 0.0 || law.stiffness.value() < 0.0 {
            DRIVES
        } else if law.viscosity.value() == 0.0 && law.drag.value() == 0.0 {
            "the last stage has no resistance and no far side"
        } else {
            "resistance vanishes with the velocity and there is no far side"
        };
        Err(IntegrationError::NeverEnds { why, last: self.state.values() })
    }

    /// Error where the table of the force has ended.
    fn refuse_unknown_force(&self) -> Solved<()> {
        let is_last = self.stage + 1 == self.stages.len();
        if is_last && self.problem.target == Target::StagesToEndOfTable {
            return Err(IntegrationError::TableEnds { last: self.state.values() });
        }
        Ok(())
    }

    /// Error where the projectile goes on to velocities behind the last row of a table.
    #[cold]
    pub(crate) fn refuse_unknown_speed(&self) -> Solved<()> {
        let last = self.state.values();
        match self.problem.laws.of(self.stage).and_then(Law::table) {
            Some(table) if table.piece(last.velocity).is_none() => {
                Err(IntegrationError::SpeedTableEnds { end: table.last(), last })
            }
            _ => Ok(()),
        }
    }

    /// Begins the flight, behind the stages that end at impact.
    #[inline(always)]
    pub(crate) fn begin(&mut self, method: &mut impl StageSolver<S>) {
        let problem = self.problem;
        self.sample(self.state);
        self.sample_until(self.state, |_| State::at_impact(problem));
        self.pass_ends(|condition, at| method.meets(condition, at));
    }

    /// Enters the present stage, if there is one.
    #[inline(always)]
    pub(crate) fn enters_stage(&mut self) -> bool {
        self.just_met = None;
        self.stage < self.stages.len()
    }

    /// The `end` that a method found; of an approach, that at the limit, if it may get there.
    ///
    /// # Errors
    /// [`IntegrationError::NeverEnds`]: it does not.
    #[inline(always)]
    pub(crate) fn arrived(&mut self, end: StageEnd<S>) -> Solved<StageEnd<S>> {
        match end {
            StageEnd::Approach(state, why) => self.arrive_in_doubt(state, why).map(StageEnd::Limit),
            end => Ok(end),
        }
    }

    /// Leaves the present stage by the `end` that a method found, which is no approach, and says whether the flight ends there too.
    #[inline(always)]
    pub(crate) fn leaves_stage(&mut self, end: StageEnd<S>, method: &mut impl StageSolver<S>) -> bool {
        let (problem, entered) = (self.problem, self.stage);
        let rests = match end {
            StageEnd::Limit(state) | StageEnd::Approach(state, _) => {
                self.state = state;
                false
            }
            StageEnd::Condition(state) => {
                self.state = state;
                self.just_met = Some(entered);
                false
            }
            StageEnd::Rest(state) => {
                let limit = problem.limit_in(&self.stages[entered]);
                let depth = if state.depth.value() > limit.value() { limit } else { state.depth };
                self.state = State { depth, ..state };
                true
            }
        };
        self.sample_rest_of_stage();
        if !rests {
            self.pass_ends(|condition, at| method.meets(condition, at));
            self.is_through = self.state.depth.value() >= problem.exit_depth.value();
        } else if !problem.laws.is_empty() {
            self.pass_if_met(|condition, at| method.meets(condition, at));
        }
        let is_over = self.is_through || self.state.velocity.value() <= 0.0;
        if is_over {
            self.stage = entered;
            self.end();
        }
        is_over
    }

    /// The exit margin of a flight through laws that has ended: not decided where it may have taken another way.
    #[cold]
    pub(crate) fn unless_doubted(&mut self, margin: Option<Bounded>) -> Option<Bounded> {
        if !self.is_in_doubt {
            return margin;
        }
        self.notes.push(TOUCHES.to_owned());
        margin.map(|margin| Bounded { bound: margin.bound.max(margin.value.abs()), ..margin })
    }

    /// Why a flight ends whose last stage has ended.
    #[cold]
    pub(crate) fn nothing_follows(&self) -> IntegrationError {
        IntegrationError::NeverEnds { why: "the last stage ends and nothing follows", last: self.state.values() }
    }

    /// Adds a row to the trajectory, if one is wanted: `state`, in the present stage.
    #[inline(always)]
    pub(crate) fn sample(&mut self, state: State<S>) {
        if matches!(self.detail, Detail::Trajectory) {
            self.push_sample(state, self.problem.force(self.stage, state.depth, state.velocity));
        }
    }

    /// As [`Course::sample`], with the force (N) that the method itself has there.
    #[cold]
    pub(crate) fn push_sample(&mut self, state: State<S>, force: S) {
        self.trajectory.push(Sample { state: state.values(), force: force.value(), stage: self.stage });
    }

    /// Adds the states at the times asked for up to that of `end`, in the present stage: those before it are `at`, the
    /// method's own solution.
    #[inline(always)]
    pub(crate) fn sample_until(&mut self, end: State<S>, at: impl FnMut(f64) -> State<S>) {
        if let Detail::Times(times) = self.detail {
            self.push_until(times, end, at);
        }
    }

    /// Adds the states at times that the steps of the method leave of the stage, by a rounding.
    #[inline(always)]
    fn sample_rest_of_stage(&mut self) {
        if let Detail::Times(times) = self.detail {
            let end = self.state;
            self.push_until(times, end, |_| end);
        }
    }

    #[cold]
    #[inline(never)]
    fn push_until(&mut self, times: &[f64], end: State<S>, mut at: impl FnMut(f64) -> State<S>) {
        while let Some(&time) = times.get(self.passed).filter(|time| **time <= end.time.value()) {
            let inside = if time == end.time.value() { end } else { at(time) };
            // An event is placed to the last digit, the path in front of it is not.
            let depth = if inside.depth.value() > end.depth.value() { end.depth } else { inside.depth };
            let velocity = if inside.velocity.value() > 0.0 { inside.velocity } else { S::zero() };
            let state = State { time: S::from_f64(time), depth, velocity };
            self.push_sample(state, self.problem.force(self.stage, depth, velocity));
            self.passed += 1;
        }
    }

    /// Lists the event `kind` at the present state, if events are wanted.
    #[inline(always)]
    pub(crate) fn event(&mut self, kind: EventKind) {
        if !matches!(self.detail, Detail::End) {
            self.events.push(Event { kind, state: self.state });
            self.sample(self.state);
        }
    }

    /// Notes a least velocity (m/s) inside a stage.
    pub(crate) fn pass_least(&mut self, velocity: f64) {
        self.least_at_ends = self.least_at_ends.min(self.energy_at(velocity));
    }

    /// `W/V0²` here.
    #[inline(always)]
    fn energy(&self) -> Bounded {
        self.energy_at(self.state.velocity.value())
    }

    /// `W/V0²` at a velocity (m/s).
    #[inline(always)]
    fn energy_at(&self, velocity: f64) -> Bounded {
        let relative = velocity / self.problem.impact_speed.value();
        Bounded { value: relative * relative, bound: self.error_bound }
    }

    /// Lists every stage end at the present state and enters the stage beyond them.
    #[inline(always)]
    pub(crate) fn pass_ends(&mut self, mut meets: impl FnMut(&Condition<S>, State<S>) -> bool) {
        while let Some(law) = self.stages.get(self.stage) {
            if law.end.value() <= self.state.depth.value() {
                self.pass_end();
            } else if self.problem.laws.is_empty() || !self.pass_if_met(&mut meets) {
                break;
            }
        }
    }

    /// Lists the end of the present stage at the present state and enters the next stage.
    #[inline(always)]
    pub(crate) fn pass_end(&mut self) {
        self.event(EventKind::boundary(self.problem, self.stage));
        self.least_at_ends = self.least_at_ends.min(self.energy());
        self.stage += 1;
        if !self.problem.laws.is_empty() {
            self.join_mass();
        }
    }

    /// Enters the piece of a table of velocity on which the projectile is, behind so many `pieces` of this stage.
    ///
    /// # Errors
    /// [`IntegrationError`]: the velocity lies behind the last row, or each piece is passed.
    #[cold]
    fn enter_piece(&mut self, pieces: usize) -> Solved<()> {
        let own = self.problem.laws.of(self.stage);
        if pieces > own.and_then(Law::table).map_or(0, |table| table.rows().len()) {
            let last = self.state.values();
            return Err(IntegrationError::NeverEnds { why: "each piece of its table is passed", last });
        }
        self.refuse_unknown_speed()?;
        self.piece = own.and_then(|law| law.piece(self.state.velocity.value()));
        Ok(())
    }

    /// Leaves the piece of a table with the `end` that a method found, and goes on behind it if another piece follows.
    #[cold]
    fn goes_on_behind(&mut self, end: &StageEnd<S>, was_in_doubt: bool) -> bool {
        let own_end = self.condition();
        let Some(row) = self.piece.take().and_then(Law::end) else { return false };
        let StageEnd::Condition(state) = *end else { return false };
        if own_end.is_some_and(|own| own.is_same(row)) {
            return false;
        }
        // The force is the same on both sides of a row: whether one that is touched is passed changes nothing.
        self.is_in_doubt = was_in_doubt;
        self.state = state;
        self.sample(state);
        true
    }

    /// Where the present stage ends besides a depth.
    #[inline(always)]
    pub(crate) fn condition(&self) -> Option<&'a Condition<S>> {
        self.problem.laws.of(self.stage)?.end()
    }

    /// Passes the end of the present stage if its condition is met in the present state, and says whether it is.
    #[cold]
    fn pass_if_met(&mut self, mut meets: impl FnMut(&Condition<S>, State<S>) -> bool) -> bool {
        let Some(condition) = self.condition() else { return false };
        // A zero that a method has located is one, whatever rounding leaves of it.
        let met_before = self.just_met.and_then(|stage| self.problem.laws.of(stage)?.end());
        let is_met = met_before.is_some_and(|before| before.is_same(condition)) || meets(condition, self.state);
        if is_met {
            self.pass_condition();
        }
        is_met
    }

    /// Lists the end of the present stage on its condition, at the present state, and enters the stage behind it.
    ///
    /// The error bound, which is of W at one depth, takes the error of the place with it (docs/theory.md, section 10).
    #[cold]
    pub(crate) fn pass_condition(&mut self) {
        let Some(condition) = self.condition() else { return };
        self.just_met = Some(self.stage);
        let is_plug = condition.is_plug();
        self.event(if is_plug { EventKind::Plug } else { EventKind::boundary(self.problem, self.stage) });
        self.least_at_ends = self.least_at_ends.min(self.energy());
        let (at, mass, before) = (self.state.values(), self.mass.value(), self.stage);
        self.stage = condition.next();
        let error = self.error_bound;
        self.join_mass();
        let (x, v) = (at.depth, at.velocity);
        let share = mass / self.mass.value();
        let slope =
            |stage: usize, mass: f64| -2.0 * self.problem.force(stage, S::from_f64(x), S::from_f64(v)).value() / mass;
        let (_, by_depth, by_velocity) = condition.gradient(x, v);
        let behind = State { velocity: v * share, ..at };
        let slope_behind = -2.0
            * self
                .problem
                .force(self.stage.min(self.stages.len() - 1), S::from_f64(x), S::from_f64(behind.velocity))
                .value()
            / self.mass.value();
        let slope_before = slope(before, mass);
        let mass_slope = self
            .problem
            .laws
            .of(self.stage)
            .and_then(|law| law.joining(self.state.depth))
            .map_or(0.0, |(_, slope)| slope);
        let jump = share * share * (slope_before - 2.0 * v * v * mass_slope / self.mass.value()) - slope_behind;
        let passing = 2.0 * v * by_depth + by_velocity * slope_before;
        let speed = self.problem.impact_speed.value();
        let place = 2.0 * v * condition.noise(x, v) / speed / speed;
        let grown = error * (share * share - jump * by_velocity / passing).abs() + (place * jump / passing).abs();
        // Where forces have no value, the flight ends with that.
        self.error_bound = if grown.is_nan() { error } else { grown };
    }

    /// Adds the mass that joins at the start of the present stage; momentum is kept.
    #[cold]
    fn join_mass(&mut self) {
        let Some((added, _)) = self.problem.laws.of(self.stage).and_then(|law| law.joining(self.state.depth)) else {
            return;
        };
        let mass = self.mass + added;
        let share = self.mass.over(mass);
        self.state.velocity = self.state.velocity * share;
        self.error_bound *= share.value() * share.value();
        self.mass = mass;
        // With another velocity nothing is met by having been met before.
        self.just_met = None;
        self.sample(self.state);
    }

    /// Lists the exit, if it is reached, and the rest, if there is no velocity left.
    #[inline(always)]
    pub(crate) fn end(&mut self) {
        if self.is_through {
            self.event(EventKind::Exit);
        }
        if self.state.velocity.value() <= 0.0 {
            self.event(EventKind::Rest);
        }
    }

    /// Exit margin as it follows from the end of the flight, for a target with an exit.
    ///
    /// Perforated: the least `W/V0²` at the stage ends and the exit. Stopped: what the stop lacks, continued in `f64`
    /// with a few roundings of its own.
    #[inline(always)]
    pub(crate) fn margin(&self) -> Bounded {
        if self.is_through {
            return self.least_at_ends.min(self.energy());
        }
        let scale = self.problem.impact_speed.value();
        let depth = self.state.depth.value();
        let value = energy_beyond_stop_of(self.problem, self.stage, depth, self.mass.value()) / scale / scale;
        if (value == 0.0 || value.is_infinite())
            && let Some(law) = self.problem.laws.of(self.stage)
            && [0.0, f64::INFINITY].contains(&law.force_value(depth, 0.0))
        {
            let exit = self.problem.exit_depth.value();
            let (value, bound) = law.margin_of_depth(self.state.values(), exit, scale, self.error_bound);
            return Bounded { value, bound };
        }
        Bounded { value, bound: self.error_bound + 8.0 * f64::EPSILON * value.abs() }
    }

    /// Whether the projectile needs more speed than it has to reach `limit` through a stage that only slows it.
    ///
    /// `dV/dx = -(r + q V)/M`: V vanishes at the depth `(M/q) ln(1 + q V/r)`, which is only approached.
    #[cold]
    pub(crate) fn is_only_approached(&self, limit: f64) -> bool {
        let law = self.stages[self.stage].values();
        speed_missing(&law, self.problem.mass.value(), self.state.values(), limit).is_some()
    }

    /// Error where an overdamped driven stage has trapped the projectile before its equilibrium `x = -p/s`.
    ///
    /// With `u = x + p/s < 0` and `l = r/(2M) + sqrt((r/(2M))² - s/M)`, the lines `V = 0` and `V = -l u` cannot be
    /// crossed outwards (drag only helps), so from between them u = 0 is approached for ever.
    #[cold]
    pub(crate) fn refuse_creep(&self, limit: f64) -> Result<(), IntegrationError> {
        let law = self.stages[self.stage].values();
        let (mass, last) = (self.problem.mass.value(), self.state.values());
        let equilibrium = -law.static_force / law.stiffness;
        let missing = equilibrium - last.depth;
        let half = 0.5 * law.viscosity / mass;
        let rate = half + (half * half - law.stiffness / mass).max(0.0).sqrt();
        if limit >= equilibrium && missing > 0.0 && last.velocity <= rate * missing {
            let why = "viscosity lets it only creep towards the depth where the spring balances the drive";
            return Err(IntegrationError::NeverEnds { why, last });
        }
        Ok(())
    }

    /// The state at the limit, without speed, where the error bound leaves open whether an approach gets there.
    ///
    /// The margin is then zero within its bound, so the outcome becomes `Undecided`.
    ///
    /// # Errors
    /// [`IntegrationError::NeverEnds`] where more is missing than the error bound: `W(limit)` would be
    /// `-missing (2 V + missing)` below that of the present state, and the place itself is rounded.
    #[cold]
    fn arrive_in_doubt(&mut self, at: State<S>, why: &'static str) -> Solved<State<S>> {
        self.refuse_unknown_force()?;
        let (last, limit) = (at.values(), self.problem.limit_of(self.stage));
        let (law, mass) = (self.stages[self.stage].values(), self.problem.mass.value());
        let v = last.velocity.max(0.0);
        let v0 = self.problem.impact_speed.value();
        let missing = speed_missing(&law, mass, State { velocity: v, ..last }, limit.value());
        let bound = self.error_bound * v0 * v0 + 4.0 * f64::EPSILON * v * v;
        if missing.is_none_or(|missing| missing * (2.0 * v + missing) > bound) {
            return Err(IntegrationError::NeverEnds { why, last });
        }
        self.notes.push(LEAST_TIME.to_owned());
        // Until the speed is an epsilon of what it was.
        let time = if v > 0.0 { -f64::EPSILON.ln() * mass / law.viscosity } else { 0.0 };
        let arrival = State { time: at.time + S::from_f64(time), depth: limit, velocity: S::zero() };
        self.sample_until(arrival, |time| {
            // Viscosity and drag alone: V falls exponentially in the end.
            let gone = -(-law.viscosity / mass * (time - last.time)).exp_m1();
            let ratio = law.drag * v * gone / law.viscosity;
            let distance = mass * v / law.viscosity * gone * if ratio == 0.0 { 1.0 } else { ratio.ln_1p() / ratio };
            let velocity = v * (1.0 - gone) / (1.0 + ratio);
            State { depth: at.depth + S::from_f64(distance), velocity: S::from_f64(velocity), ..at }
        });
        Ok(arrival)
    }

    /// The flight that ends at the present state, with its exit margin.
    #[inline(always)]
    pub(crate) fn finish(self, margin: Option<Bounded>) -> Flight<S> {
        let outcome = if margin.is_some_and(|margin| !margin.is_decided()) {
            Outcome::Undecided
        } else if self.is_through {
            Outcome::Perforated
        } else {
            self.problem.stop_in(self.stage)
        };
        Flight {
            outcome,
            stage: self.stage,
            end: self.state,
            events: self.events,
            exit_margin: margin.map(|margin| margin.value),
            exit_margin_error: margin.map(|margin| margin.bound),
            cost: self.cost,
            trajectory: self.trajectory,
            step_limit: None,
            notes: self.notes,
        }
    }
}

/// What is said of a flight on which a condition may or may not be met.
const TOUCHES: &str =
    "the condition of a stage is touched within the error bound: whether the stage ends there is open";

/// A flight that never starts: at rest on the face (`V0 = 0`), or no target at all (exit depth 0).
///
/// `None` for every other problem. Methods ask this first, so that none has to treat a vanishing scale.
#[inline(always)]
pub(crate) fn at_once<S: Scalar>(problem: &Problem<S>, detail: Detail) -> Option<Flight<S>> {
    if starts(problem) { None } else { Some(never_starts(problem, detail)) }
}

/// Whether a flight starts at all.
#[inline(always)]
pub(crate) fn starts<S: Scalar>(problem: &Problem<S>) -> bool {
    problem.impact_speed.value() > 0.0 && problem.exit_depth.value() > 0.0
}

#[cold]
fn never_starts<S: Scalar>(problem: &Problem<S>, detail: Detail) -> Flight<S> {
    let is_through = problem.exit_depth.value() <= 0.0;
    let moves = problem.impact_speed.value() > 0.0;
    let mut course = Course::new(problem, if matches!(detail, Detail::Trajectory) { Detail::Events } else { detail });
    course.sample_until(course.state, |_| State::at_impact(problem));
    // Ends at the face itself (k d = 0 leaves no crater, but a user's stage may end at 0) are reached at once.
    course.pass_ends(Condition::is_met);
    course.stage = course.stage.min(problem.stages.len() - 1);
    course.is_through = is_through;
    course.notes.push("no integration: the flight ends at impact".to_owned());
    course.end();
    course.finish((is_through && moves).then_some(Bounded { value: 1.0, bound: 0.0 }))
}

/// Solves `problem` stage by stage with `method`.
///
/// A stage end or an exit that is reached without speed counts as reached. A stage without length is passed where it
/// stands. The flight ends in the stage solved last, and the samples of exit and rest show the force of that stage.
///
/// # Errors
/// [`IntegrationError::NeverEnds`] where neither rest nor exit is reached; what `method` refuses.
#[inline(always)]
pub(crate) fn solve<S: Scalar>(
    problem: &Problem<S>,
    detail: Detail,
    method: &mut impl StageSolver<S>,
) -> Solved<Flight<S>> {
    if let Some(flight) = at_once(problem, detail) {
        return Ok(flight);
    }
    let mut course = Course::new(problem, detail);
    course.begin(method);
    // Each round passes a stage, or ends the flight.
    for _ in 0..course.stages.len() {
        if !course.enters_stage() {
            break;
        }
        let end = end_of_stage(&mut course, method)?;
        if course.leaves_stage(end, method) {
            let margin = if problem.has_exit() { Some(method.margin(&mut course)?) } else { None };
            // Here, for a flight that is changed where it is finished would be copied.
            let margin = if problem.laws.is_empty() { margin } else { course.unless_doubted(margin) };
            return Ok(course.finish(margin));
        }
    }
    Err(course.nothing_follows())
}

/// How the present stage of `course` ends by `method`; an approach that may get to the limit does.
///
/// # Errors
/// As [`StageSolver::solve_stage`].
#[inline(always)]
pub(crate) fn end_of_stage<S: Scalar>(
    course: &mut Course<'_, S>,
    method: &mut impl StageSolver<S>,
) -> Solved<StageEnd<S>> {
    let has_laws = !course.problem.laws.is_empty();
    // A table of velocity is solved piece by piece: V falls or rises from row to row, and passes none twice.
    let mut pieces = 0;
    loop {
        let was_in_doubt = has_laws && course.is_in_doubt;
        if has_laws {
            course.enter_piece(pieces)?;
        }
        let end = method.solve_stage(course)?;
        if !(has_laws && course.goes_on_behind(&end, was_in_doubt)) {
            return course.arrived(end);
        }
        pieces += 1;
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::{Integrator, Taylor};
    use crate::physics::Scene;

    /// Mass 2 kg, one stage, impact at 300 m/s.
    fn alone(stage: Stage, exit_depth: f64) -> Problem {
        Problem::of_stages(2.0, 300.0, [stage]).with_exit(exit_depth)
    }

    fn stage(p: f64, r: f64, q: f64) -> Stage {
        Stage { viscosity: r, ..Stage::tunnel(p, q) }
    }

    #[test]
    fn the_lesser_margin_has_the_bound_of_the_greater_as_far_as_it_reaches_below() {
        let bounded = |value, bound| Bounded { value, bound };
        for (greater, bound) in [(bounded(1.5, 0.75), 0.25), (bounded(1.5, 0.125), 0.125), (bounded(3.0, 0.5), 0.125)] {
            let lesser = bounded(1.0, 0.125);
            for least in [lesser.min(greater), greater.min(lesser)] {
                assert_eq!(least, bounded(1.0, bound), "{}", greater.value);
            }
        }
        for (value, bound, decided) in [(2.0, 1.0, true), (-2.0, 1.0, true), (1.0, 1.0, false), (f64::NAN, 0.0, false)]
        {
            assert_eq!(bounded(value, bound).is_decided(), decided, "{value}");
        }
    }

    /// r/(2M) = 10/s and s/M = 100/s² damp critically: what is no faster than 10/s of the distance to -p/s = 1 m creeps.
    #[test]
    fn a_drive_with_critical_damping_traps_what_is_slower_than_its_rate_and_nothing_faster() {
        let drive = Stage { stiffness: 200.0, ..stage(-200.0, 40.0, 0.0) };
        let problem = alone(drive, 2.0);
        for (depth, velocity, is_trapped) in
            [(0.0, 10.0, true), (0.0, 10.1, false), (0.5, 5.0, true), (0.5, 5.1, false)]
        {
            let state = State { time: 0.0, depth, velocity };
            let course = Course { state, ..Course::new(&problem, Detail::End) };
            assert_eq!(course.refuse_creep(2.0).is_err(), is_trapped, "{state}");
        }
    }

    /// r/M = 0.75/s: `V = V1 e^(-0.75 t)` from 3 m/s, and `x = (V1 - V) M/r` from 0.5 m.
    #[test]
    fn an_approach_by_viscosity_alone_has_its_states_at_given_times() {
        let problem = alone(stage(0.0, 1.5, 0.0), 4.5);
        let times = [1.25, 2.0, 7.0];
        let mut course = Course::new(&problem, Detail::Times(&times));
        course.arrive_in_doubt(State { time: 1.0, depth: 0.5, velocity: 3.0 }, "").unwrap();
        assert_eq!(course.trajectory.len(), times.len());
        for (row, time) in course.trajectory.iter().zip(times) {
            let velocity = 3.0 * (-0.75 * (time - 1.0)).exp();
            let depth = 0.5 + (3.0 - velocity) / 0.75;
            let State { depth: x, velocity: v, .. } = row.state;
            assert!((x / depth - 1.0).abs() < 1e-14 && (v / velocity - 1.0).abs() < 1e-14, "{:?}", row.state);
        }
    }

    /// What `Course::pass_condition` makes of an error bound at the first end of a flight, and the flight.
    fn bound_behind(problem: &Problem, bound: f64) -> (f64, Flight) {
        let flight = Taylor::default().solve(problem, Detail::Events).unwrap();
        let end = flight.events.iter().find(|event| !matches!(event.kind, EventKind::Exit | EventKind::Rest)).unwrap();
        let mut course = Course { error_bound: bound, state: end.state, ..Course::new(problem, Detail::End) };
        course.pass_condition();
        (course.error_bound, flight)
    }

    /// Two flights whose V0² differ a little: a drag Q takes `e^(-2 Q x/M)` of the difference, in front of the condition
    /// and behind it.
    #[test]
    fn an_error_in_front_of_a_condition_grows_as_the_difference_of_two_flights_does() {
        let plug = "[projectile]\nmass = 20\ndiameter = 0.06\nnose = { shape = 'flat' }\n[resistance]\nS = 12\nk = 0\n\
                    [target]\nstrength = 36e6\ndensity = 2400\nthickness = 0.3\n\
                    [perforation]\ncriterion = 'plug'\nhalf_angle = '60 deg'\nshear_strength = 7.2e6\n";
        let stages = |parameters: &str, end: &str| {
            format!(
                "projectile.mass = 2\ntarget.thickness = 0.1\n{parameters}[[stage]]\nstatic_force = 8e5\ndrag = 3\n{end}\n\
                 [[stage]]\nstatic_force = 1e5\ndrag = 2\n"
            )
        };
        let known = "[parameters]\nQ = '3 kg/m'\na = '1 MN'\nR = '20 MN/m'\nH = '0.1 m'\n";
        let slowed = stages(known, "until = 'a + Q*V^2 = R*(H - x)'");
        let joined = stages(known, "until = 'a + Q*V^2 = R*(H - x)'\nadd_mass = 0.5");
        let at_speed = stages("", "end_velocity = 200\nadd_mass = 0.5");
        for (text, speed, added) in [
            (plug, 160.0, None),
            (&slowed, 290.0, Some(0.0)),
            (&joined, 290.0, Some(0.5)),
            (&at_speed, 290.0, Some(0.5)),
        ] {
            let scene = Scene::from_toml(text, "bound").unwrap();
            let of = |energy: f64| scene.resolve(energy.sqrt()).unwrap();
            let (energy, step) = (speed * speed, 1e-4 * speed * speed);
            let (factor, flight) = bound_behind(&of(energy), 1.0);
            let depth = flight.events[0].state.depth;
            let drag = scene.tunnel().map_or(3.0, |tunnel| tunnel.drag);
            let behind = added.map_or(0.0, |added| 2.0 * (0.1 - depth) / (scene.mass + added));
            let left = (-2.0 * (drag * depth / scene.mass + behind)).exp();
            let [low, high] = [energy - step, energy + step].map(|energy| {
                let end = Taylor::default().solve(&of(energy), Detail::End).unwrap().end;
                end.velocity * end.velocity
            });
            let exact = ((high - low) / (2.0 * step) / left).abs();
            assert!((factor / exact - 1.0).abs() < 1e-6, "{text}: {factor} and {exact}");
        }
    }

    /// r/M = 0.75/s takes 300 m/s in 400 m.
    #[test]
    fn an_exit_that_is_approached_within_the_error_bound_is_an_event_and_not_decided() {
        let flight = Taylor::default().solve(&alone(stage(0.0, 1.5, 0.0), 400.0), Detail::Events).unwrap();
        assert_eq!(crate::testing::kinds(&flight.events), [EventKind::Exit, EventKind::Rest]);
        assert_eq!(flight.outcome, Outcome::Undecided);
    }

    /// 2 kg and 0.5 kg keep 0.8 of the speed, and 0.64 of what V² is uncertain by.
    #[test]
    fn a_mass_that_joins_takes_its_share_of_the_error_bound() {
        let text = "projectile.mass = 2\n[[stage]]\nstatic_force = 36000\nend = 0.1\nadd_mass = 0.5\n[[stage]]\nstatic_force = 1\n";
        let problem = Scene::from_toml(text, "bound").unwrap().resolve(100.0).unwrap();
        let mut course = Course { error_bound: 1.0, ..Course::new(&problem, Detail::End) };
        course.pass_end();
        assert!((course.error_bound - 0.64).abs() < 1e-15 && course.mass == 2.5, "{}", course.error_bound);
    }

    /// Two flights whose conditions differ a little, and the rounding of the condition in place of that.
    #[test]
    fn the_rounding_of_the_place_of_a_condition_counts_as_far_as_it_changes_the_energy_behind() {
        let speed = 290.0;
        let of = |shift: f64| {
            let text = format!(
                "projectile.mass = 2\ntarget.thickness = 0.1\n[parameters]\nQ = '3 kg/m'\na = '{:?} N'\nR = '20 MN/m'\n\
                 H = '0.1 m'\n[[stage]]\nstatic_force = 8e5\ndrag = 3\nuntil = 'a + Q*V^2 = R*(H - x)'\nadd_mass = 0.5\n\
                 [[stage]]\nstatic_force = 1e5\n",
                1e6 + shift
            );
            Scene::from_toml(&text, "bound").unwrap().resolve(speed).unwrap()
        };
        let (bound, flight) = bound_behind(&of(0.0), 0.0);
        let [low, high] = [-100.0, 100.0].map(|shift| {
            let end = Taylor::default().solve(&of(shift), Detail::End).unwrap().end;
            end.velocity * end.velocity
        });
        let met = flight.events[0].state;
        let noise = of(0.0).laws.of(0).unwrap().end().unwrap().noise(met.depth, met.velocity);
        let exact = ((high - low) / 200.0 * noise / speed / speed).abs();
        assert!((bound / exact - 1.0).abs() < 1e-6, "{bound:e} and {exact:e}");
    }

    #[test]
    fn a_stage_without_an_end_that_never_stops_is_refused_for_its_own_reason() {
        for (stage, why) in [
            (stage(-1.0, 0.0, 0.0), "drives"),
            (stage(-1.0, 1.5, 0.0), "drives"),
            (stage(0.0, 0.0, 0.0), "no resistance"),
            (stage(0.0, 1.5, 0.0), "vanishes with the velocity"),
            (stage(0.0, 0.0, 1.0), "vanishes with the velocity"),
        ] {
            let endless = alone(stage, f64::INFINITY);
            let error = Course::new(&endless, Detail::End).limit().unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
            assert_eq!(Course::new(&alone(stage, 4.0), Detail::End).limit(), Ok(4.0));
        }
    }

    /// r/M = 0.75/s takes 3 m/s in 4 m: from x = 0.5 m no speed is left at 4.5 m.
    #[test]
    fn an_approach_that_the_error_bound_cannot_tell_from_arrival_counts_as_arrival() {
        let v0 = 300.0;
        let arrival = |exit: f64, velocity: f64, error_bound: f64| {
            let problem = alone(stage(0.0, 1.5, 0.0), exit);
            let mut course = Course { error_bound, ..Course::new(&problem, Detail::End) };
            let arrived = course.arrive_in_doubt(State { time: 1.0, depth: 0.5, velocity }, "");
            assert_eq!(arrived.is_ok(), course.notes == [LEAST_TIME]);
            arrived
        };
        let state = arrival(4.5, 3.0, 0.0).unwrap();
        assert_eq!((state.depth, state.velocity), (4.5, 0.0));
        // Until the speed is an epsilon of what it was: M/r ln(1/eps).
        assert!(((state.time - 1.0) / (2.0 / 1.5 * 36.043_653_389_117_15) - 1.0).abs() < 1e-14, "{state}");
        // The place is rounded: a spacing is 4e-15 of V², and 4 eps V² are 8e-15.
        assert!(arrival(4.5_f64.next_up(), 3.0, 0.0).is_ok() && arrival(4.5 + 1e-14, 3.0, 0.0).is_err());
        // r dx/M = 0.75e-9 m/s are missing, and 2 V as much of V²: 4.5e-9 m²/s².
        assert!(arrival(4.5 + 1e-9, 3.0, 4.6e-9 / v0 / v0).is_ok());
        assert!(arrival(4.5 + 1e-9, 3.0, 4.4e-9 / v0 / v0).is_err());
        assert!(arrival(1.5, 0.75, 0.0).unwrap().time > 1.0, "slower than 1 m/s");
        // At rest 4 m before it, 3 m/s are missing. Speed below zero is the error of a method.
        for velocity in [0.0, -0.1] {
            // Without speed no time passes.
            assert_eq!(arrival(4.5, velocity, 9.1 / v0 / v0).unwrap().time, 1.0);
            assert!(arrival(4.5, velocity, 8.9 / v0 / v0).is_err());
        }
        // A resisting force stops the projectile, and nothing is in doubt.
        let problem = alone(stage(1.0, 1.5, 0.0), 4.5);
        assert!(Course::new(&problem, Detail::End).arrive_in_doubt(State::at_impact(&problem), "").is_err());
    }
}
