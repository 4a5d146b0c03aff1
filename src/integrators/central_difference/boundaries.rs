//! Stage ends, exit and rest: where they lie inside a step, and what [`Boundaries`] makes of them.

use super::scheme::{Deceleration as _, Node, Pause, REMEDY, Rule, Stepper, Sum};
use super::stability::cannot_end;
use super::{Boundaries, CentralDifference, Steps};
use crate::integrators::flight::Course;
use crate::integrators::outcome::{Detail, Flight, IntegrationError, Solved};
use crate::physics::{Condition, Problem, Scalar, State};

/// Steps without any change of x and V after which the scheme counts as stuck for ever.
const STUCK_STEPS: u64 = 1 << 16;

/// Halvings of a step in which a condition is met: more than a number has digits.
const HALVINGS: u32 = 80;

/// A step in which something happens, from one state to the next; the velocity at its end may be negative.
pub(crate) struct Step<S> {
    pub(crate) from: State<S>,
    pub(crate) to: State<S>,
    /// That of the parabola of the depth, which meets the depth at the end: -a(i) in this scheme.
    pub(crate) deceleration: S,
    pub(crate) size: S,
}

impl<S: Scalar> Step<S> {
    /// Time into the step at which V = 0, if V(i+1) <= 0.
    fn rest(&self) -> Option<S> {
        (self.to.velocity.value() <= 0.0)
            .then(|| (self.size * self.from.velocity).over(self.from.velocity - self.to.velocity))
    }

    /// Depth after `tau`, on the parabola.
    fn depth(&self, tau: S) -> S {
        if tau.value() >= self.size.value() {
            return self.to.depth;
        }
        self.from.depth + tau * (self.from.velocity - S::from_f64(0.5) * tau * self.deceleration)
    }

    /// Velocity after `tau`, on the chord; not below zero.
    fn velocity(&self, tau: S) -> S {
        let v = self.from.velocity + tau.over(self.size) * (self.to.velocity - self.from.velocity);
        if v.value() > 0.0 { v } else { S::zero() }
    }

    /// When the parabola first comes to depth `place`, if it ever does.
    fn passage(&self, place: S) -> Option<S> {
        let distance = place - self.from.depth;
        let v = self.from.velocity;
        let discriminant = v * v - S::from_f64(2.0) * self.deceleration * distance;
        (discriminant.value() >= 0.0).then(|| (S::from_f64(2.0) * distance).over(v + discriminant.sqrt()))
    }

    /// When depth `place` is reached within the step, before rest or with it; `None` if it is not.
    fn reach(&self, place: S) -> Option<S> {
        let rest = self.rest();
        let last = rest.unwrap_or(self.size);
        let passage = self.passage(place).filter(|tau| tau.value() <= last.value());
        if self.depth(last).value() >= place.value() {
            return Some(passage.unwrap_or(last));
        }
        // Whole steps decide; only in a step that comes to rest may the parabola turn after touching the place.
        rest.and(passage)
    }

    /// State at `time`, V on the chord and x on the parabola.
    fn inside(&self, time: f64) -> State<S> {
        let time = S::from_f64(time);
        let tau = time - self.from.time;
        State { time, depth: self.depth(tau), velocity: self.velocity(tau) }
    }

    /// State in which depth `place` is reached; `None` if it is not.
    fn at(&self, place: S) -> Option<State<S>> {
        let state = |tau| State { time: self.from.time + tau, depth: place, velocity: self.velocity(tau) };
        self.reach(place).map(state)
    }

    /// State at the end, not moving back.
    fn arrival(&self) -> State<S> {
        if self.to.velocity.value() <= 0.0 { State { velocity: S::zero(), ..self.to } } else { self.to }
    }

    /// State in which depth `place` counts as passed, inside the step or at its end; `None` if it is not.
    pub(crate) fn passed(&self, place: S, is_located: bool) -> Option<State<S>> {
        if is_located {
            return self.at(place);
        }
        let arrival = self.arrival();
        (place.value() <= arrival.depth.value()).then_some(arrival)
    }

    /// State of rest, if V(i+1) <= 0; not before depth `passed`.
    pub(crate) fn at_rest(&self, passed: S, is_located: bool) -> Option<State<S>> {
        let tau = self.rest()?;
        if !is_located {
            let turned_back = self.from.depth.value() > self.to.depth.value();
            return Some(State { depth: if turned_back { self.from.depth } else { self.to.depth }, ..self.arrival() });
        }
        let depth = self.depth(tau);
        let depth = if depth.value() > passed.value() { depth } else { passed };
        Some(State { time: self.from.time + tau, depth, velocity: S::zero() })
    }
}

/// One solution in the making: the scheme, and what has happened so far.
pub(super) struct Run<'a, S> {
    stepper: Stepper<'a, S>,
    course: Course<'a, S>,
}

impl<'a, S: Scalar> Run<'a, S> {
    /// [`CentralDifference::solve_in`].
    pub(super) fn solve(
        options: &'a CentralDifference,
        problem: &'a Problem<S>,
        detail: Detail<'a>,
    ) -> Solved<Flight<S>> {
        let mut run = Self { stepper: Stepper::new(options, problem), course: Course::new(problem, detail) };
        // Ends at the face are reached at once; `Stepper::new` has passed them.
        let impact = State::at_impact(problem);
        run.course.sample_until(impact, |_| impact);
        run.pass_ends(0..run.stepper.stage, impact);
        let max_steps = options.max_steps;
        let is_hopeless = matches!(options.steps, Steps::Uniform(h) if cannot_end(problem, h * max_steps as f64));
        // Steps up to the last change of x or V.
        let mut moved = 0;
        loop {
            if !problem.laws.is_empty() {
                run.pass_what_is_met();
            }
            (run.course.stage, run.course.state) = (run.stepper.stage, run.stepper.state());
            let limit = run.course.limit()?.value();
            if !problem.laws.is_empty() {
                run.course.refuse_unknown_speed()?;
            }
            if matches!(run.course.detail, Detail::Trajectory) {
                run.course.push_sample(run.course.state, run.stepper.node.d * run.stepper.mass);
            }
            let (before, steps) = (run.course.state, run.stepper.cost.steps);
            let left = max_steps - steps;
            if left == 0 || is_hopeless && steps >= STUCK_STEPS {
                return Err(IntegrationError::StepBudgetSpent { max_steps, remedy: REMEDY, last: before.values() });
            }
            let one_by_one = run.course.detail >= Detail::Trajectory;
            let allowance = if one_by_one { 1 } else { left.min(STUCK_STEPS) };
            let deceleration = run.stepper.node.d;
            let has_ended = match run.stepper.cruise(limit, allowance) {
                Pause::Allowance => {
                    let (to, size) = (run.stepper.state(), run.stepper.node.h);
                    let step = Step { from: before, to, deceleration, size };
                    run.course.sample_until(to, |time| step.inside(time));
                    false
                }
                Pause::Crossing { x, u } => run.cross(x, u)?,
                Pause::Rest(next) => run.come_to_rest(next)?,
                Pause::Condition(next) => {
                    run.stepper.cost.force_evaluations += options.velocity.evaluations();
                    run.meet(next)?
                }
            };
            if has_ended {
                return Ok(run.finish());
            }
            let (after, steps) = (run.stepper.state(), run.stepper.cost.steps);
            if (after.depth.value(), after.velocity.value()) != (before.depth.value(), before.velocity.value()) {
                moved = steps;
            }
            if steps - moved >= STUCK_STEPS {
                return run.never_ends("a step no longer changes depth or velocity, which only approach their limits");
            }
        }
    }

    fn never_ends<T>(&self, why: &'static str) -> Solved<T> {
        Err(IntegrationError::NeverEnds { why, last: self.stepper.state().values() })
    }

    fn finite(&self, what: &'static str, number: S) -> Solved<()> {
        if number.value().is_finite() {
            return Ok(());
        }
        Err(IntegrationError::NotFinite { what, last: self.stepper.state().values() })
    }

    /// The end of the present stage, where the scheme lands on it.
    fn landing(&self) -> Option<S> {
        let end = self.stepper.problem.stages[self.stepper.stage].end;
        let lands = self.stepper.options.boundaries == Boundaries::Landed;
        (lands && end.value() < self.stepper.problem.exit_depth.value()).then_some(end)
    }

    /// Enters the stage behind every end whose condition is met at the present node, and lets the mass join that joined
    /// the flight.
    fn pass_what_is_met(&mut self) {
        let state = self.stepper.state();
        let velocity = state.velocity * self.stepper.mass.over(self.course.mass);
        (self.course.stage, self.course.state) = (self.stepper.stage, State { velocity, ..state });
        self.course.pass_ends(Condition::is_met);
        let has_joined = self.course.mass.value() != self.stepper.mass.value();
        if has_joined || self.course.stage != self.stepper.stage {
            self.stepper.enter(self.course.stage, self.course.mass, self.course.state);
        }
    }

    /// How far into `step` the condition of the present stage is met, if it is met before the limit and before rest.
    fn condition_in(&self, step: &Step<S>) -> Option<S> {
        let condition = self.condition()?;
        let Rule::Law(_, _, side) = self.stepper.law else { return None };
        let limit = self.stepper.problem.limit_of(self.stepper.stage);
        let last = step.reach(limit).or(step.rest()).unwrap_or(step.size);
        let is_met = |tau: f64| {
            let tau = S::from_f64(tau);
            side * condition.value(step.depth(tau).value(), step.velocity(tau).value()) <= 0.0
        };
        if !is_met(last.value()) {
            return None;
        }
        let (mut low, mut high) = (0.0, last.value());
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if is_met(middle) { high = middle } else { low = middle }
        }
        Some(S::from_f64(high))
    }

    /// The node at the end of a next step to `x` with V(i+1/2) = `u`, if the condition of the present stage is met in it
    /// before the limit.
    fn condition_before(&mut self, x: Sum<S>, u: Sum<S>, h: S) -> Solved<Option<Node<S>>> {
        if self.condition().is_none() {
            return Ok(None);
        }
        let next = self.stepper.arrive(x, u, h);
        self.finite("velocity", next.v)?;
        let is_met = self.condition_in(&self.step_to(x.value, next.v, h)).is_some();
        Ok(is_met.then_some(next))
    }

    fn condition(&self) -> Option<&'a Condition<S>> {
        self.stepper.problem.laws.of(self.stepper.stage)?.end()
    }

    /// Takes the step to the node `next`, in which the condition of the present stage is met. True if the run ends in it.
    fn meet(&mut self, next: Node<S>) -> Solved<bool> {
        self.finite("velocity", next.v)?;
        let step = self.step_to(next.x.value, next.v, next.h);
        let part = self.condition_in(&step).unwrap_or(next.h);
        let boundaries = self.stepper.options.boundaries;
        if boundaries == Boundaries::Landed && part.value() < next.h.value() {
            self.stepper.step_max = self.stepper.step_max.max(part.value());
            let (x, u) = self.stepper.node.ahead(part, self.stepper.options.summation);
            let landed = self.stepper.arrive(x, u, part);
            self.finite("velocity", landed.v)?;
            return Ok(self.meet_at(landed, part, part));
        }
        Ok(self.meet_at(next, next.h, part))
    }

    /// Completes the step of `size` to the node `next`, the condition met after `part` of it, and starts afresh.
    fn meet_at(&mut self, next: Node<S>, size: S, part: S) -> bool {
        self.stepper.cost.steps += 1;
        let mut step = self.step_to(next.x.value, next.v, size);
        let before = step.from.time;
        if size.value() < self.stepper.clock.step().value() {
            self.stepper.clock.tick_part(size);
        } else {
            self.stepper.clock.tick();
        }
        step.to.time = self.stepper.clock.now();
        let is_located = self.stepper.options.boundaries == Boundaries::Interpolated;
        let met = if is_located {
            State { time: before + part, depth: step.depth(part), velocity: step.velocity(part) }
        } else {
            step.arrival()
        };
        let is_at_end = self.stepper.options.boundaries != Boundaries::StepEnd;
        let end = self.condition().filter(|_| is_at_end).map_or(met, |condition| condition.at_end(met));
        (self.course.stage, self.course.state) = (self.stepper.stage, end);
        self.course.sample_until(end, |time| step.inside(time));
        self.course.pass_condition();
        self.course.pass_ends(Condition::is_met);
        let stage = self.course.stage;
        let share = self.stepper.mass.over(self.course.mass);
        self.stepper.stage = stage;
        // What lies between the condition and the end of the step.
        let has_ended = (end.velocity.value() <= 0.0
            || is_located
            || step.to.depth.value() >= self.course.problem.exit_depth.value())
            && self.push_events(&step, stage);
        if has_ended {
            return true;
        }
        let state = if is_located {
            State { velocity: step.to.velocity * share, ..step.to }
        } else {
            State { velocity: self.course.state.velocity, ..step.to }
        };
        self.stepper.enter(self.course.stage, self.course.mass, state);
        false
    }

    /// The step from the present node to depth `x` and velocity `v`. Its end has the time of its start until the clock
    /// has ticked.
    fn step_to(&self, x: S, v: S, size: S) -> Step<S> {
        let from = self.stepper.state();
        Step { from, to: State { depth: x, velocity: v, ..from }, deceleration: self.stepper.node.d, size }
    }

    /// Treats a next step that reaches a stage end or the exit. True if the run ends in it.
    fn cross(&mut self, x: Sum<S>, u: Sum<S>) -> Solved<bool> {
        self.finite("depth", x.value)?;
        let h = self.stepper.clock.step();
        if let Some(met) = self.condition_before(x, u, h)? {
            return self.meet(met);
        }
        if let Some(end) = self.landing() {
            // The velocity at its end does not matter for the place.
            let step = self.step_to(x.value, self.stepper.node.v, h);
            return self.land(end, step.reach(end).unwrap_or(h));
        }
        // The stability limit of the old stage applies to this step; the force at its end is that of the new stage.
        let first = self.stepper.stage;
        self.stepper.step_max = self.stepper.step_max.max(h.value());
        self.stepper.enter_stage_at(x.value);
        let next = self.stepper.arrive(x, u, h);
        self.finite("velocity", next.v)?;
        Ok(self.complete(next, first))
    }

    /// Treats a next step, to the node `next`, that comes to rest before any stage end or exit. True if the run ends
    /// in it.
    fn come_to_rest(&mut self, next: Node<S>) -> Solved<bool> {
        self.finite("velocity", next.v)?;
        self.stepper.cost.force_evaluations += self.stepper.options.velocity.evaluations();
        if self.condition().is_some() && self.condition_in(&self.step_to(next.x.value, next.v, next.h)).is_some() {
            return self.meet(next);
        }
        if let Some(end) = self.landing()
            && let Some(part) = self.step_to(next.x.value, next.v, next.h).reach(end)
        {
            // The step went past the end and came back.
            self.stepper.cost.rejected_steps += 1;
            return self.land(end, part);
        }
        let static_force = self.stepper.law.at(next.x.value, S::zero()).value();
        if static_force == 0.0 && next.v.value() == 0.0 {
            return self.never_ends("the force dies out with the velocity");
        }
        Ok(self.complete(next, self.stepper.stage))
    }

    /// Takes the step shortened to `part`, which lands on the stage end `end`, and starts afresh behind it.
    fn land(&mut self, end: S, part: S) -> Solved<bool> {
        let first = self.stepper.stage;
        self.stepper.step_max = self.stepper.step_max.max(part.value());
        let (_, u) = self.stepper.node.ahead(part, self.stepper.options.summation);
        let next = self.stepper.arrive(Sum::new(end), u, part);
        self.finite("velocity", next.v)?;
        if next.v.value() <= 0.0 {
            return Ok(self.complete(next, first));
        }
        self.stepper.cost.steps += 1;
        let step = self.step_to(end, next.v, part);
        self.stepper.clock.tick_part(part);
        let landing = State { time: self.stepper.clock.now(), depth: end, velocity: next.v };
        self.course.sample_until(landing, |time| step.inside(time));
        self.stepper.enter_stage_at(end);
        self.pass_ends(first..self.stepper.stage, landing);
        self.stepper.start(landing);
        Ok(false)
    }

    /// Completes the step to the node `next`, with the events in it from stage `first` on. True if the run ends in it.
    fn complete(&mut self, next: Node<S>, first: usize) -> bool {
        self.stepper.cost.steps += 1;
        let mut step = self.step_to(next.x.value, next.v, next.h);
        self.stepper.clock.tick();
        step.to.time = self.stepper.clock.now();
        let has_ended = self.push_events(&step, first);
        let until = if has_ended { self.course.state } else { step.to };
        self.course.stage = first;
        self.course.sample_until(until, |time| step.inside(time));
        self.stepper.node = next;
        has_ended
    }

    /// Lists the stage ends from stage `first` on, the exit and the rest of `step`. True if the run ends in it.
    fn push_events(&mut self, step: &Step<S>, first: usize) -> bool {
        let problem = self.stepper.problem;
        let is_located = self.stepper.options.boundaries != Boundaries::StepEnd;
        let mut deepest = step.from.depth;
        for index in first..problem.stages.len() {
            let end = problem.stages[index].end;
            if end.value() > problem.exit_depth.value() {
                break;
            }
            let Some(state) = step.passed(end, is_located) else { break };
            deepest = end;
            self.pass_ends(index..index + 1, state);
        }
        let exit = if problem.has_exit() { step.passed(problem.exit_depth, is_located) } else { None };
        // A mass that joined inside the step shares the momentum.
        let exit = match exit {
            Some(exit) if !problem.laws.is_empty() => {
                Some(State { velocity: exit.velocity * self.stepper.mass.over(self.course.mass), ..exit })
            }
            other => other,
        };
        self.course.is_through = exit.is_some();
        let Some(end) = exit.or_else(|| step.at_rest(deepest, is_located)) else { return false };
        self.course.state = end;
        self.course.stage = self.stepper.stage;
        self.course.end();
        true
    }

    fn pass_ends(&mut self, stages: std::ops::Range<usize>, state: State<S>) {
        self.course.state = state;
        for index in stages {
            self.course.stage = index;
            self.course.pass_end();
        }
    }

    /// The solution, whose last event is its end.
    fn finish(mut self) -> Flight<S> {
        let problem = self.stepper.problem;
        self.stepper.judge_steps();
        // A place at a stage end belongs to the stage that ends there.
        let place = if self.course.is_through { problem.exit_depth } else { self.course.state.depth };
        if self.course.is_through {
            self.course.pass_least(self.stepper.speed_min);
        }
        if !problem.laws.have_conditions() {
            self.course.stage = problem.stages.iter().take_while(|stage| stage.end.value() < place.value()).count();
        }
        let exit_margin = problem.has_exit().then(|| self.course.margin().value);
        if self.course.detail >= Detail::Events {
            let note = "error bar of the exit margin not given: a fixed step has no error estimate";
            self.course.notes.push(note.to_owned());
        }
        if matches!(self.course.detail, Detail::Times(_)) {
            let note = "states at given times interpolated, V linearly and x along its parabola: the scheme has no \
                        solution inside a step";
            self.course.notes.push(note.to_owned());
        }
        let (cost, step_limit) = (self.stepper.cost, Some(self.stepper.step_limit));
        Flight { exit_margin, cost, step_limit, ..self.course.finish(None) }
    }
}
