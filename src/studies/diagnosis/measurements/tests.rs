use super::super::faulty::{answer, failure};
use super::super::simulation::{Place, Rules, simulate};
use super::super::{Counts, Plan, QuantityOrder, Solver, Subject, diagnose};
use super::*;
use crate::exchange::peers::{PeerAnswer, PeerFailure, PeerIdentity};
use crate::physics::Outcome;
use crate::studies::order::Class;

/// The slopes and weights of the classical scheme of Runge and Kutta.
const CLASSICAL: ([f64; 3], [f64; 4]) = ([0.5, 0.5, 1.0], [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]);

/// How an end within a step is placed.
#[derive(Clone, Copy, PartialEq)]
enum Placed {
    /// By a part of the step.
    ByStep,
    /// On the chord of the step.
    OnChord,
    /// Rest on the chord, all else by a part of the step.
    RestOnChord,
    /// With the velocity of the start of the step.
    WithVelocityOfStart,
    /// At the end of the step.
    AtStepEnd,
    /// Rest by a part of the step, all else at the end of the step, with the depth that it should have.
    PassedAtStepEnd,
}

/// A scheme of four slopes.
#[derive(Clone, Copy)]
struct Stepping {
    numbers: ([f64; 3], [f64; 4]),
    placed: Placed,
    /// Steps of a flight without `dt_s`, from tolerance and impact speed.
    steps: fn(f64, f64) -> f64,
    /// Time that a shortened step takes, from its length and that of a whole one.
    clock: fn(f64, f64) -> f64,
    /// Part of the force of the stage before in the first slope behind its end.
    stale: f64,
    is_fixed: bool,
}

const RIGHT: Stepping = Stepping {
    numbers: CLASSICAL,
    placed: Placed::ByStep,
    steps: |_, _| 200.0,
    clock: |part, _| part,
    stale: 0.0,
    is_fixed: false,
};

impl Stepping {
    fn end(self, problem: &Problem, step: f64) -> State {
        let ([a2, a3, a4], [b1, b2, b3, b4]) = self.numbers;
        let mut now = State::at_impact(problem);
        let mut before: Option<Stage> = None;
        for law in &problem.stages {
            let limit = law.end.min(problem.exit_depth);
            let mut left_over = before.take();
            loop {
                let ahead = |h: f64| {
                    let a = |x: f64, v: f64| -law.force(x, v) / problem.mass;
                    let (x, v) = (now.depth, now.velocity);
                    let of_before = left_over.map_or(0.0, |law| -law.force(x, v) / problem.mass - a(x, v));
                    let k1 = [v, a(x, v) + self.stale * of_before];
                    let k2 = [v + a2 * h * k1[1], a(x + a2 * h * k1[0], v + a2 * h * k1[1])];
                    let k3 = [v + a3 * h * k2[1], a(x + a3 * h * k2[0], v + a3 * h * k2[1])];
                    let k4 = [v + a4 * h * k3[1], a(x + a4 * h * k3[0], v + a4 * h * k3[1])];
                    let sum = |i: usize| h * (b1 * k1[i] + b2 * k2[i] + b3 * k3[i] + b4 * k4[i]);
                    State { time: now.time + h, depth: x + sum(0), velocity: v + sum(1) }
                };
                let next = ahead(step);
                if next.depth < limit && next.velocity > 0.0 {
                    (now, left_over) = (next, None);
                    continue;
                }
                let first = |is_past: &dyn Fn(State) -> bool| {
                    let (mut low, mut high) = (0.0, step);
                    for _ in 0..100 {
                        let middle = 0.5 * (low + high);
                        if is_past(ahead(middle)) { high = middle } else { low = middle }
                    }
                    ahead(high)
                };
                if self.placed == Placed::AtStepEnd {
                    now = State { velocity: next.velocity.max(0.0), ..next };
                    if next.velocity <= 0.0 || limit == problem.exit_depth {
                        return now;
                    }
                    break;
                }
                if self.placed == Placed::PassedAtStepEnd && next.velocity > 0.0 {
                    now = State { depth: limit, ..next };
                    if limit == problem.exit_depth {
                        return now;
                    }
                    break;
                }
                let rests = next.velocity <= 0.0 && first(&|state| state.velocity <= 0.0).depth < limit;
                let on_chord = self.placed == Placed::OnChord || (rests && self.placed == Placed::RestOnChord);
                let end = if on_chord {
                    let part = if rests {
                        now.velocity / (now.velocity - next.velocity)
                    } else {
                        (limit - now.depth) / (next.depth - now.depth)
                    };
                    let between = |from: f64, to: f64| from + part * (to - from);
                    State {
                        time: between(now.time, next.time),
                        depth: between(now.depth, next.depth),
                        velocity: between(now.velocity, next.velocity),
                    }
                } else if rests {
                    first(&|state| state.velocity <= 0.0)
                } else {
                    first(&|state| state.depth >= limit)
                };
                let of_start = self.placed == Placed::WithVelocityOfStart && limit == problem.exit_depth;
                let velocity = if of_start { now.velocity } else { end.velocity };
                now = State {
                    time: now.time + (self.clock)(end.time - now.time, step),
                    depth: if rests { end.depth } else { limit },
                    velocity: if rests { 0.0 } else { velocity },
                };
                if rests || limit == problem.exit_depth {
                    return now;
                }
                before = Some(*law);
                break;
            }
        }
        now
    }
}

/// A solver made of what it answers.
struct Answering<F> {
    is_fixed: bool,
    answer: F,
}

impl<F: FnMut(&PeerRequest) -> Option<PeerAnswer>> Solver for Answering<F> {
    fn identity(&self) -> PeerIdentity {
        PeerIdentity { fixed_step: self.is_fixed, ..PeerIdentity::default() }
    }

    fn command(&self) -> String {
        String::new()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        (self.answer)(request).ok_or_else(|| failure("it never ends"))
    }

    fn restart(&mut self) -> bool {
        true
    }
}

impl Stepping {
    fn solver(self) -> impl Solver {
        let answer = move |request: &PeerRequest| {
            let problem = request.problem(None);
            let exact = Taylor::default().solve(&problem, Detail::End).ok()?;
            // One step for all exits that are asked with one absolute tolerance.
            let duration = request.atol[0] / (request.rtol * problem.impact_speed);
            let steps = (self.steps)(request.rtol, problem.impact_speed) + 0.37;
            let step = request.dt_s.unwrap_or(duration / steps);
            Some(answer(exact.outcome, self.end(&problem, step)))
        };
        Answering { is_fixed: self.is_fixed, answer }
    }
}

/// A solver that is exact by other `rules`, and does `report` to the end of a flight that stops.
fn by_rules(rules: Rules, report: fn(&mut State)) -> impl Solver {
    let answer = move |request: &PeerRequest| {
        let problem = request.problem(None);
        let mut end = simulate(&problem, rules)?.end;
        if problem.has_exit() && end.depth >= problem.exit_depth {
            return Some(answer(Outcome::Perforated, end));
        }
        report(&mut end);
        Some(answer(Outcome::Stopped, end))
    };
    Answering { is_fixed: false, answer }
}

/// A solver that is exact for another force.
fn of_force(force: fn(&Place<'_>, f64) -> f64) -> impl Solver {
    by_rules(Rules { force: (force, 1.0), ..Rules::default() }, |_| ())
}

/// A solver that is right but for what is done to the problem and to the end.
fn altered(read: fn(&mut Problem), report: fn(&Problem, &mut State)) -> impl Solver {
    let answer = move |request: &PeerRequest| {
        let mut problem = request.problem(None);
        read(&mut problem);
        let flight = Taylor::default().solve(&problem, Detail::End).ok()?;
        let mut end = flight.end;
        report(&problem, &mut end);
        Some(answer(flight.outcome, end))
    };
    Answering { is_fixed: false, answer }
}

/// The force with `factor` times the drag.
fn with_drag(place: &Place<'_>, factor: f64) -> f64 {
    let &Place { law, depth, velocity, .. } = place;
    law.force(depth, velocity) + (factor - 1.0) * law.drag * velocity * velocity
}

/// What is measured of `solver`, of which nothing is known.
fn measured_of(solver: impl Solver) -> Option<Cause> {
    measured_with_claim(solver, None)
}

/// The same of one that claims an order.
fn measured_with_claim(mut solver: impl Solver, formal_order: Option<f64>) -> Option<Cause> {
    let PeerIdentity { name, version, method, fixed_step, .. } = solver.identity();
    let peer = Subject { name, version, method, command: String::new(), fixed_step, reads: "stages" };
    let found = Diagnosis {
        verdict: Verdict::Failed,
        peer,
        counts: Counts::default(),
        causes: Vec::new(),
        scheme: None,
        orders: vec![QuantityOrder {
            quantity: "depth",
            formal_order,
            observed_order: None,
            interval: None,
            class: Class::AtFloor,
            verdict: Verdict::Skipped,
        }],
        separation: None,
        questions: Vec::new(),
    };
    measured(&mut Asking::new(&mut solver), &[], &found)
}

fn id_and_statement(cause: Option<Cause>) -> (String, String) {
    cause.map_or_else(Default::default, |cause| (cause.id, cause.statement))
}

#[test]
fn nothing_is_measured_of_a_right_solver() {
    assert_eq!(measured_of(of_force(|place, _| place.law.force(place.depth, place.velocity))), None);
    for is_fixed in [false, true] {
        assert_eq!(measured_with_claim(Stepping { is_fixed, ..RIGHT }.solver(), Some(4.0)), None);
    }
    // An implicit scheme is no polynomial of the step, as little as the exact flight.
    let exact = |request: &PeerRequest| {
        let flight = Taylor::default().solve(&request.problem(None), Detail::End).ok()?;
        Some(answer(flight.outcome, flight.end))
    };
    assert_eq!(measured_with_claim(Answering { is_fixed: true, answer: exact }, Some(4.0)), None);
}

#[test]
fn a_drag_that_changes_at_a_speed_is_measured() {
    let found =
        measured_of(of_force(|place, _| with_drag(place, if place.velocity > 300.0 { 1.2 } else { 1.0 }))).unwrap();
    assert_eq!(found.id, "term:drag");
    assert!((found.factor.unwrap() - 1.2).abs() < 1e-4, "{found:?}");
    assert!(found.statement.contains("above 300.0") && found.statement.ends_with("right below"), "{found:?}");
    // No two values: as measured, and no factor.
    let found = measured_of(of_force(|place, _| with_drag(place, 1.0 + 1.0 / place.velocity))).unwrap();
    assert!(found.id == "term:drag" && found.factor.is_none(), "{found:?}");
    assert!(found.statement.contains("1.1") && found.certainty == Certainty::Likely, "{found:?}");
}

#[test]
fn ends_on_a_chord_and_velocities_of_another_place_are_measured() {
    let of = |placed| id_and_statement(measured_of(Stepping { placed, steps: |_, _| 7.0, ..RIGHT }.solver()));
    let (id, statement) = of(Placed::OnChord);
    assert!(id == "event-straight" && statement.starts_with("time and velocity at the exit are"), "{statement}");
    let (id, statement) = of(Placed::RestOnChord);
    assert!(id == "event-straight" && statement.starts_with("the depth at rest is"), "{statement}");
    let (id, statement) = of(Placed::WithVelocityOfStart);
    assert!(id == "velocity-stale" && statement.ends_with("that of the start of the step"), "{statement}");
}

#[test]
fn a_tolerance_of_its_own_unit_is_measured() {
    // Twice the steps where everything is sixteen times as large.
    let steps = |_, speed: f64| (speed * 32.0).powf(0.6).max(1.0);
    let (id, _) = id_and_statement(measured_of(Stepping { steps, ..RIGHT }.solver()));
    assert_eq!(id, "absolute-tolerance");
    // A force that is added falls with the size too, in proportion to it.
    let added = of_force(|place, _| {
        place.law.force(place.depth, place.velocity) + if place.law.static_force > 0.0 { 0.01 } else { 0.0 }
    });
    assert_eq!(measured_of(added), None);
}

#[test]
fn weights_that_do_not_add_up_are_measured() {
    let (slopes, [b1, b2, b3, b4]) = CLASSICAL;
    let found = measured_of(Stepping { numbers: (slopes, [b1, b2 + 0.02, b3, b4]), ..RIGHT }.solver()).unwrap();
    assert!(found.id == "weights" && (found.factor.unwrap() - 1.02).abs() < 1e-9, "{found:?}");
}

#[test]
fn a_wrong_number_of_a_scheme_is_measured_by_one_step() {
    let (slopes, weights) = CLASSICAL;
    let of = |numbers| id_and_statement(measured_of(Stepping { numbers, is_fixed: true, ..RIGHT }.solver()));
    let (id, statement) = of(([0.5, 0.5, 0.5], weights));
    assert_eq!(id, "scheme-coefficient");
    assert!(statement.contains("slope 4 taken at 0.500000 h, not 1"), "{statement}");
    let (id, statement) = of((slopes, [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]));
    assert_eq!(id, "scheme-coefficient");
    assert!(statement.contains("a weight of 0.333333 for slope 1, not 0.166667"), "{statement}");
}

#[test]
fn a_force_kept_over_the_end_of_a_stage_is_measured_by_one_step() {
    let (id, statement) = id_and_statement(measured_of(Stepping { stale: 1.0, is_fixed: true, ..RIGHT }.solver()));
    assert_eq!(id, "force-stale");
    assert!(statement.contains("a h in V with a factor 0.833333"), "{statement}");
}

#[test]
fn a_speed_that_is_read_or_reported_wrongly_is_no_drag() {
    let cut = altered(|problem| problem.impact_speed = problem.impact_speed.floor().max(1.0), |_, _| ());
    let rounded = altered(|_| (), |_, end| end.velocity = (end.velocity / 3.0).round() * 3.0);
    for found in [measured_of(cut), measured_of(rounded)] {
        let is_told =
            found.as_ref().is_some_and(|cause| cause.id == "term:drag" || cause.certainty == Certainty::Certain);
        assert!(!is_told, "{found:?}");
    }
}

#[test]
fn a_wrong_time_of_coasting_alone_is_no_wrong_weight() {
    let late = altered(
        |_| (),
        |problem, end| {
            if problem.stages[0].drag == 0.0 && problem.stages[0].static_force == 0.0 {
                end.time *= 1.2;
            }
        },
    );
    assert_ne!(id_and_statement(measured_of(late)).0, "weights");
}

/// The first cause of a scheme of fixed steps.
fn first_cause(stepping: Stepping) -> (String, Certainty) {
    let plan = Plan { seed: 1, questions: 200, asks_edges: false };
    let cause = diagnose(&mut stepping.solver(), plan, &|_, _| {}).causes.swap_remove(0);
    (cause.id, cause.certainty)
}

#[test]
fn times_of_shortened_steps_and_flights_of_whole_steps_are_told() {
    let fixed = Stepping { is_fixed: true, ..RIGHT };
    let late = Stepping { clock: |_, whole| whole, ..fixed };
    assert_eq!(first_cause(late), ("event-time-late".to_owned(), Certainty::Likely));
    let early = Stepping { clock: |_, _| 0.0, ..fixed };
    // What one step takes says nothing where it depends on the step that was asked for.
    assert_eq!(measured_of(Stepping { clock: |_, whole| 0.5 * whole, ..fixed }.solver()), None);
    assert_eq!(first_cause(early), ("event-time-early".to_owned(), Certainty::Likely));
    // Of a scheme that is none of those known, since it is of order three.
    let kutta = ([0.5, 0.5, 1.0], [1.0 / 6.0, 2.0 / 3.0, 0.0, 1.0 / 6.0]);
    let at_steps = Stepping { placed: Placed::AtStepEnd, numbers: kutta, ..fixed };
    assert_eq!(first_cause(at_steps), ("exit-late".to_owned(), Certainty::Certain));
}

#[test]
fn boundaries_taken_at_the_end_of_a_step_are_told_from_a_scheme_of_order_one() {
    let passed = Stepping { placed: Placed::PassedAtStepEnd, is_fixed: true, ..RIGHT };
    assert_eq!(first_cause(passed), ("stage-end-late".to_owned(), Certainty::Likely));
}

#[test]
fn a_start_without_its_half_step_is_measured() {
    let start = |part: f64| {
        let answer = move |request: &PeerRequest| {
            let mut problem = request.problem(None);
            let deceleration = problem.stages[0].force(0.0, problem.impact_speed) / problem.mass;
            problem.impact_speed -= part * request.dt_s? * deceleration;
            let flight = Taylor::default().solve(&problem, Detail::End).ok()?;
            Some(answer(flight.outcome, flight.end))
        };
        id_and_statement(measured_of(Answering { is_fixed: true, answer }))
    };
    let (id, statement) = start(0.5);
    assert!(
        id == "start-kick" && statement.ends_with("V0 is taken for V half a step before the impact"),
        "{statement}"
    );
    assert!(start(0.1).1.contains("V is 0.100000 a h too small"));
    assert_eq!(start(0.0).0, "");
    // A velocity that is reported so is none of the flight: its time is right.
    let answer = |request: &PeerRequest| {
        let problem = request.problem(None);
        let deceleration = problem.stages[0].force(0.0, problem.impact_speed) / problem.mass;
        let flight = Taylor::default().solve(&problem, Detail::End).ok()?;
        let start = problem.impact_speed - 0.5 * request.dt_s? * deceleration;
        let velocity = (start * start - 2.0 * deceleration * flight.end.depth).max(0.0).sqrt();
        Some(answer(flight.outcome, State { velocity, ..flight.end }))
    };
    assert_eq!(measured_of(Answering { is_fixed: true, answer }), None);
}

#[test]
fn a_clock_that_goes_on_in_rejected_steps_is_told_from_late_events() {
    let first = |mut solver: Box<dyn Solver>| diagnose(&mut *solver, Plan::default(), &|_, _| {}).causes.swap_remove(0);
    // Behind a force that changes, by another part of the time in every flight.
    let rejected = |problem: &Problem, end: &mut State| {
        let is_constant = |stage: &Stage| stage.stiffness == 0.0 && stage.viscosity == 0.0 && stage.drag == 0.0;
        if !problem.stages.iter().all(is_constant) {
            end.time *= 1.0 + 0.1 * (1e3 * end.time / (1.0 + end.time)).fract();
        }
    };
    let cause = first(Box::new(altered(|_| (), rejected)));
    assert!(cause.id == "clock" && cause.certainty == Certainty::Likely, "{cause:?}");
    let late = |_: &Problem, end: &mut State| end.time *= 1.0 + 0.1 * (1e3 * end.time / (1.0 + end.time)).fract();
    assert_ne!(first(Box::new(altered(|_| (), late))).id, "clock");
}

#[test]
fn what_questions_without_an_answer_share_is_told() {
    let answer = |request: &PeerRequest| {
        let problem = request.problem(None);
        let has_gap = problem.stages.iter().any(|stage| *stage == Stage { end: stage.end, ..Stage::free() });
        let flight = Taylor::default().solve(&problem, Detail::End).ok()?;
        // At the tightest tolerance alone.
        (!has_gap || request.rtol > TOLERANCES[2]).then(|| answer(flight.outcome, flight.end))
    };
    let found = diagnose(&mut Answering { is_fixed: false, answer }, Plan::default(), &|_, _| {});
    let first = &found.causes[0];
    assert!(first.id == "no-answer" && first.statement.ends_with("all of them hold `air-gap`"), "{first:?}");
}

#[test]
fn a_speed_of_rest_is_named_where_flights_begin_below_it() {
    // It leaves round-off of a flight that begins below.
    let mut early = by_rules(Rules { rest_speed: 0.1, ..Rules::default() }, |end| {
        let State { time, depth, .. } = *end;
        *end = State { time: time.max(1e-31), depth: depth.max(1e-33), velocity: 0.0 };
    });
    let found = diagnose(&mut early, Plan::default(), &|_, _| {});
    let first = &found.causes[0];
    assert!(first.id == "rest-threshold" && first.certainty == Certainty::Certain, "{first:?}");
    assert!((first.factor.unwrap() - 0.1).abs() < 1e-9, "{first:?}");
}
