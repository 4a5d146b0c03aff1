//! Solvers with faults that no hypothesis computes, and right ones: what is each told?
//!
//! What is told is written out, and stands beside each. A wrong number in it is a wrong answer to a person.

use std::cell::Cell;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::super::measurements::measured;
use super::super::simulation::{Place, Rules, simulate};
use super::super::{
    Asking, Cause, Counts, Diagnosis, Plan, QuantityOrder, Question, Solver, Subject, Verdict, by_questions,
    questions_to,
};
use super::linearised::{Linear, Passing};
use super::series::{RIGHT_SERIES, Series};
use super::several::{ADAMS, MOULTON, Scheme};
use super::stepping::{CLASSICAL, Placed, RIGHT, Stepping};
use super::{answer, failure};
use crate::exchange::peers::{ORDER_OF_ALL, PeerAnswer, PeerFailure, PeerIdentity, PeerRequest, PeerScene};
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, Integrator, Taylor, VelocityAt};
use crate::physics::{Event, EventKind, Outcome, Problem, Scene, Stage, State};
use crate::studies::order::Class;

/// What gives an answer to a question, or none.
type Answers = Box<dyn FnMut(&PeerRequest) -> Option<PeerAnswer>>;

/// A solver made of what it answers, which it begins anew when it is started again.
pub(in super::super) struct Answering {
    pub identity: PeerIdentity,
    start: Box<dyn Fn() -> Answers>,
    answers: Answers,
}

impl Answering {
    pub(in super::super) fn new<F: FnMut(&PeerRequest) -> Option<PeerAnswer> + 'static>(
        start: impl Fn() -> F + 'static,
    ) -> Self {
        let start = move || -> Answers { Box::new(start()) };
        Self {
            identity: PeerIdentity { name: "made".to_owned(), ..PeerIdentity::default() },
            answers: start(),
            start: Box::new(start),
        }
    }

    /// One that keeps nothing.
    pub(in super::super) fn plain(answers: impl Fn(&PeerRequest) -> Option<PeerAnswer> + Clone + 'static) -> Self {
        Self::new(move || answers.clone())
    }

    pub(in super::super) fn in_fixed_steps(mut self) -> Self {
        self.identity.fixed_step = true;
        self
    }

    /// One that claims the order `order` of every quantity.
    fn claiming(mut self, order: f64) -> Self {
        self.identity.claimed_orders.insert(ORDER_OF_ALL.to_owned(), order);
        self
    }

    /// One that does `report` to what it answers.
    fn reporting(self, report: fn(&mut PeerAnswer)) -> Self {
        let Self { identity, start, .. } = self;
        let again = move || {
            let mut answers = start();
            move |request: &PeerRequest| {
                let mut answer = answers(request)?;
                report(&mut answer);
                Some(answer)
            }
        };
        Self { identity, ..Self::new(again) }
    }

    pub(in super::super) fn of_scenes(mut self) -> Self {
        self.identity.reads_scene = true;
        self
    }
}

impl Solver for Answering {
    fn identity(&self) -> PeerIdentity {
        self.identity.clone()
    }

    fn command(&self) -> String {
        "made".to_owned()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        (self.answers)(request).ok_or_else(|| failure("it never ends"))
    }

    fn restart(&mut self) -> bool {
        self.answers = (self.start)();
        true
    }
}

/// The exact flight through `problem`.
pub(in super::super) fn exact(problem: &Problem) -> Option<Flight> {
    Taylor::default().solve(problem, Detail::Events).ok()
}

/// A solver that is right but for what is done to the problem and to the end.
pub(in super::super) fn altered(read: fn(&mut Problem), report: fn(&Problem, &mut State)) -> Answering {
    by_request(move |_, problem| read(problem), move |_, problem, end| report(problem, end))
}

/// The same of one to which the question matters too.
fn by_request(
    read: impl Fn(&PeerRequest, &mut Problem) + Clone + 'static,
    report: impl Fn(&PeerRequest, &Problem, &mut State) + Clone + 'static,
) -> Answering {
    Answering::plain(move |request| {
        let mut problem = request.problem(None);
        read(request, &mut problem);
        let flight = exact(&problem)?;
        let mut end = flight.end;
        report(request, &problem, &mut end);
        Some(answer(flight.outcome, end))
    })
}

/// Does `change` to each stage, by the depth of the exit and the impact speed.
fn each_stage(problem: &mut Problem, change: fn(&mut Stage, f64, f64)) {
    let (exit, speed) = (problem.exit_depth, problem.impact_speed);
    problem.stages.iter_mut().for_each(|law| change(law, exit, speed));
}

/// A solver that is exact by other `rules`, and does `report` to the end of a flight that stops.
fn by_rules(rules: Rules, report: fn(&mut State)) -> Answering {
    Answering::plain(move |request| {
        let problem = request.problem(None);
        let mut end = simulate(&problem, rules)?.end;
        if problem.has_exit() && end.depth >= problem.exit_depth {
            return Some(answer(Outcome::Perforated, end));
        }
        report(&mut end);
        Some(answer(Outcome::Stopped, end))
    })
}

/// A solver that is exact for another force.
fn of_force(force: fn(&Place<'_>, f64) -> f64) -> Answering {
    by_rules(Rules { force: (force, 1.0), ..Rules::default() }, |_| ())
}

/// The force with `factor` times the drag.
fn with_drag(place: &Place<'_>, factor: f64) -> f64 {
    let &Place { law, depth, velocity, .. } = place;
    law.force(depth, velocity) + (factor - 1.0) * law.drag * velocity * velocity
}

/// A solver that lists events too, and does `report` to the answer.
fn listing(report: fn(&Problem, &mut PeerAnswer)) -> Answering {
    Answering::plain(move |request| {
        let problem = request.problem(None);
        let flight = exact(&problem)?;
        let mut said = answer(flight.outcome, flight.end);
        said.events = flight.events.iter().copied().collect();
        report(&problem, &mut said);
        Some(said)
    })
}

/// A stage that a solver flies through by itself.
pub(in super::super) struct Staged<'a> {
    request: &'a PeerRequest,
    problem: &'a Problem,
    index: usize,
    /// The problem of this stage alone.
    pub alone: &'a Problem,
}

/// A solver that goes from stage to stage, and does `change` to the end of each flight through one.
pub(in super::super) fn by_stages(change: fn(&Staged<'_>, &mut State)) -> Answering {
    Answering::plain(move |request| {
        let problem = request.problem(None);
        let mut at = State { time: 0.0, depth: 0.0, velocity: problem.impact_speed };
        let mut events = Vec::new();
        for (index, law) in problem.stages.iter().enumerate() {
            let limit = law.end.min(problem.exit_depth);
            let shifted =
                Stage { static_force: law.static_force + law.stiffness * at.depth, end: f64::INFINITY, ..*law };
            let alone = Problem::of_stages(problem.mass, at.velocity, [shifted]);
            let alone = if limit.is_finite() { alone.with_exit(limit - at.depth) } else { alone };
            let flight = exact(&alone)?;
            let mut end = flight.end;
            change(&Staged { request, problem: &problem, index, alone: &alone }, &mut end);
            at = State { time: at.time + end.time, depth: at.depth + end.depth, velocity: end.velocity };
            if flight.outcome != Outcome::Perforated || law.end >= problem.exit_depth {
                return Some(PeerAnswer { events, ..answer(flight.outcome, at) });
            }
            at.depth = law.end;
            events.push(Event { kind: EventKind::StageEnd(index), state: at });
        }
        None
    })
}

/// A solver of fixed steps, by the end of a flight with steps of so many seconds.
fn stepwise(end_of: impl Fn(&Problem, f64) -> Option<State> + Clone + 'static) -> Answering {
    let end = move |request: &PeerRequest| {
        let problem = request.problem(None);
        let end = end_of(&problem, request.dt_s?)?;
        let is_through = problem.has_exit() && end.depth >= problem.exit_depth;
        Some(answer(if is_through { Outcome::Perforated } else { Outcome::Stopped }, end))
    };
    Answering::plain(end).in_fixed_steps()
}

impl Scheme {
    fn solver(self) -> Answering {
        stepwise(move |problem, h| self.end(problem, h))
    }
}

impl Linear {
    fn solver(self) -> Answering {
        stepwise(move |problem, h| self.end(problem, h))
    }
}

impl Stepping {
    fn solver(self) -> Answering {
        let solver = Answering::plain(move |request| {
            let mut problem = request.problem(None);
            let flight = exact(&problem)?;
            (self.read)(&mut problem);
            // One step for all exits that are asked with one absolute tolerance.
            let duration = request.atol[0] / (request.rtol * problem.impact_speed);
            let steps = (self.steps)(request.rtol, problem.impact_speed) + 0.37;
            let step = request.dt_s.unwrap_or(duration / steps);
            Some(answer(flight.outcome, self.end(&problem, step)?))
        });
        if self.is_fixed { solver.in_fixed_steps() } else { solver }
    }
}

impl Series {
    fn solver(self) -> Answering {
        Answering::plain(move |request| {
            let problem = request.problem(None);
            Some(answer(exact(&problem)?.outcome, self.end(&problem)?))
        })
    }
}

/// Central difference, with something done to each answer.
fn central(report: fn(f64, &Problem, &mut Flight)) -> Answering {
    let solver = Answering::plain(move |request| {
        let (problem, step) = (request.problem(None), request.dt_s?);
        let scheme = CentralDifference::uniform(step, VelocityAt::PredictedHalfStep, Boundaries::Landed);
        let mut flight = scheme.solve(&problem, Detail::End).ok()?;
        report(step, &problem, &mut flight);
        Some(answer(flight.outcome, flight.end))
    });
    solver.in_fixed_steps()
}

/// Whether the flight ends with it.
fn is_end(event: &Event) -> bool {
    matches!(event.kind, EventKind::Exit | EventKind::Rest)
}

/// Central difference that lists events too, with `report` done to them.
fn listing_in_steps(velocity: VelocityAt, boundaries: Boundaries, report: fn(&Problem, &mut Vec<Event>)) -> Answering {
    let solver = Answering::plain(move |request| {
        let problem = request.problem(None);
        let scheme = CentralDifference::uniform(request.dt_s?, velocity, boundaries);
        let flight = scheme.solve(&problem, Detail::Events).ok()?;
        let mut events = flight.events.iter().copied().collect();
        report(&problem, &mut events);
        Some(PeerAnswer { events, ..answer(flight.outcome, flight.end) })
    });
    solver.in_fixed_steps()
}

/// How a solver is asked.
#[derive(Clone, Copy)]
enum Asked {
    /// By questions that measure it alone.
    Measured,
    /// The same, of one that claims this order.
    Claiming(f64),
    /// By so many questions.
    Questions(usize),
    /// By so many, and those at their edges.
    AtEdges(usize),
}

impl Asked {
    fn questions(self) -> usize {
        match self {
            Measured | Claiming(_) => 0,
            Questions(count) | AtEdges(count) => count,
        }
    }
}

use Asked::{AtEdges, Claiming, Measured, Questions};

/// A solver, and what it is told.
struct Told {
    /// What is wrong with it.
    what: &'static str,
    solver: fn() -> Answering,
    asked: Asked,
    /// The first cause in words, the verdict before it where all of a diagnosis was asked for.
    says: &'static str,
}

/// How many solvers are tried, those that are asked at most `questions`, and which are told anything but what stands beside them.
pub(crate) fn mistold(questions: usize) -> (usize, Vec<String>) {
    let tried: Vec<&Told> = TOLD.iter().filter(|told| told.asked.questions() <= questions).collect();
    let shared = Shared::default();
    let wrong = tried.par_iter().filter_map(|Told { what, solver, asked, says }| {
        let said = said(solver(), *asked, &shared);
        (said != *says).then(|| format!("{what}: \"{said}\" in place of \"{says}\""))
    });
    (tried.len(), wrong.collect())
}

/// Questions by their number, whether those at edges are among them, and whether they are of scenes and of fixed steps: what a
/// fault makes of a question is computed once, and not for each solver.
#[derive(Default)]
struct Shared(Mutex<HashMap<Kind, Arc<Vec<Question>>>>);

type Kind = (usize, [bool; 3]);

impl Shared {
    fn questions(&self, identity: &PeerIdentity, plan: Plan) -> Arc<Vec<Question>> {
        let key = (plan.questions, [plan.asks_edges, identity.reads_scene, identity.fixed_step]);
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let there = known().get(&key).map(Arc::clone);
        // The lock is not held meanwhile, and the first one made stays.
        there.unwrap_or_else(|| {
            let made = Arc::new(questions_to(identity, plan));
            Arc::clone(known().entry(key).or_insert(made))
        })
    }
}

/// What `solver` is told.
fn said(mut solver: Answering, asked: Asked, shared: &Shared) -> String {
    let words = |cause: Option<&Cause>| {
        cause.map_or_else(String::new, |Cause { id, factor, certainty, statement, .. }| {
            let factor = factor.map_or_else(String::new, |factor| format!(", {factor:.6}"));
            format!("{id}, {certainty}{factor}: {statement}")
        })
    };
    let diagnosed = |mut solver: Answering, questions, asks_edges| {
        let all = shared.questions(&solver.identity(), Plan { seed: 1, questions, asks_edges });
        let found = by_questions(&mut solver, &all, &|_, _| {});
        format!("{} | {}", found.verdict.name(), words(found.causes.first()))
    };
    match asked {
        Measured => words(measured_of(&mut solver, None).as_ref()),
        Claiming(order) => words(measured_of(&mut solver, Some(order)).as_ref()),
        Questions(count) => diagnosed(solver, count, false),
        AtEdges(count) => diagnosed(solver, count, true),
    }
}

/// What is measured of `solver`, of which nothing is known but the order that it claims.
pub(in super::super) fn measured_of(solver: &mut Answering, formal_order: Option<f64>) -> Option<Cause> {
    let PeerIdentity { name, version, method, fixed_step, .. } = solver.identity();
    let peer = Subject { name, version, method, command: String::new(), fixed_step, reads: "stages" };
    let order = QuantityOrder {
        quantity: "depth",
        formal_order,
        observed_order: None,
        interval: None,
        class: Class::AtFloor,
        verdict: Verdict::Skipped,
    };
    let found = Diagnosis {
        verdict: Verdict::Failed,
        peer,
        counts: Counts::default(),
        causes: Vec::new(),
        scheme: None,
        orders: vec![order],
        separation: None,
        questions: Vec::new(),
    };
    measured(&mut Asking::new(solver), &[], &found)
}

const FIXED: Stepping = Stepping { is_fixed: true, ..RIGHT };
/// Kutta's scheme of order three.
const KUTTA: Stepping = Stepping { numbers: ([0.5, 0.5, 1.0], [1.0 / 6.0, 2.0 / 3.0, 0.0, 1.0 / 6.0]), ..FIXED };
const HEUN: ([f64; 3], [f64; 4]) = ([1.0, 1.0, 1.0], [0.5, 0.5, 0.0, 0.0]);

fn with_weights(weights: [f64; 4]) -> Stepping {
    Stepping { numbers: (CLASSICAL.0, weights), ..RIGHT }
}

/// A time that is late by another part in every flight.
fn delay(end: &mut State) {
    end.time *= 1.0 + 0.1 * (1e3 * end.time / (1.0 + end.time)).fract();
}

/// Whether nothing but constant forces acts.
fn is_steady(problem: &Problem) -> bool {
    problem.stages.iter().all(|stage| stage.stiffness == 0.0 && stage.viscosity == 0.0 && stage.drag == 0.0)
}

/// V0 taken for the velocity `part` of a step before the impact.
fn started(part: f64) -> Answering {
    let read = move |request: &PeerRequest, problem: &mut Problem| {
        let deceleration = problem.stages[0].force(0.0, problem.impact_speed) / problem.mass;
        problem.impact_speed -= part * request.dt_s.unwrap_or(0.0) * deceleration;
    };
    by_request(read, |_, _, _| ()).in_fixed_steps()
}

/// A reader of scenes that is right but for what is done to the scene, whose S is given by then.
fn of_scene(alter: fn(&mut PeerScene)) -> Answering {
    with_s(72.0, -0.5, alter)
}

/// One whose S, where none is given, is `factor (fc/MPa)^exponent`.
fn with_s(factor: f64, exponent: f64, alter: fn(&mut PeerScene)) -> Answering {
    let answers = move |request: &PeerRequest| {
        let mut scene = request.scene.clone()?;
        scene.static_factor.get_or_insert(factor * (scene.strength_pa * 1e-6).powf(exponent));
        alter(&mut scene);
        let thickness = scene.thickness_m.map_or_else(String::new, |h| format!("target.thickness = {h:?}"));
        let stiffness =
            scene.crater_stiffness_n_m.map_or_else(String::new, |c| format!("resistance.crater_stiffness = {c:?}"));
        let text = format!(
            "projectile.mass = {:?}\nprojectile.diameter = {:?}\nprojectile.nose.factor = {:?}\ntarget.strength = {:?}\n\
             target.density = {:?}\nresistance.S = {:?}\nresistance.B = {:?}\nresistance.k = {:?}\n\
             impact.velocity = {:?}\nperforation.criterion = \"{}\"\n{thickness}\n{stiffness}\n",
            scene.mass_kg,
            scene.diameter_m,
            scene.nose_factor,
            scene.strength_pa,
            scene.density_kg_m3,
            scene.static_factor?,
            scene.inertia_factor,
            scene.crater_ratio,
            scene.velocity_m_s,
            scene.criterion,
        );
        let flight = exact(&Scene::from_toml(&text, "asked").ok()?.problem().ok()?)?;
        Some(answer(flight.outcome, flight.end))
    };
    Answering::plain(answers).of_scenes()
}

/// r V0 over p in the only stage, 0 where there are several.
fn viscous_share(problem: &Problem) -> f64 {
    match problem.stages[..] {
        [Stage { static_force, viscosity, .. }] => viscosity * problem.impact_speed / static_force,
        _ => 0.0,
    }
}

/// `number` with `digits` digits behind the first.
fn rounded(number: f64, digits: usize) -> f64 {
    format!("{number:.digits$e}").parse().unwrap_or(f64::NAN)
}

const TOLD: &[Told] = &[
    Told {
        what: "nothing, by a law in code",
        solver: || of_force(|place, _| place.law.force(place.depth, place.velocity)),
        asked: Measured,
        says: "",
    },
    Told { what: "nothing, by the classical scheme", solver: || RIGHT.solver(), asked: Measured, says: "" },
    Told { what: "nothing, in fixed steps", solver: || FIXED.solver(), asked: Claiming(4.0), says: "" },
    Told {
        what: "nothing, as of an implicit scheme, which is no polynomial of the step",
        solver: || altered(|_| (), |_, _| ()).in_fixed_steps(),
        asked: Claiming(4.0),
        says: "",
    },
    Told {
        what: "a force that is added falls with the size too, in proportion to it",
        solver: || {
            of_force(|place, _| {
                place.law.force(place.depth, place.velocity) + if place.law.static_force > 0.0 { 0.01 } else { 0.0 }
            })
        },
        asked: Measured,
        says: "",
    },
    Told {
        what: "the velocity is read in whole m/s",
        solver: || altered(|problem| problem.impact_speed = problem.impact_speed.floor().max(1.0), |_, _| ()),
        asked: Measured,
        says: "",
    },
    Told {
        what: "the velocity is reported in steps of 3 m/s",
        solver: || altered(|_| (), |_, end| end.velocity = (end.velocity / 3.0).round() * 3.0),
        asked: Measured,
        says: "exit-velocity-late, likely: V is the same at every exit within a step: that of the end of the step",
    },
    Told {
        what: "the time is late where there is no force",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    if problem.stages[0].drag == 0.0 && problem.stages[0].static_force == 0.0 {
                        end.time *= 1.2;
                    }
                },
            )
        },
        asked: Measured,
        says: "",
    },
    Told {
        what: "more drag above 300 m/s",
        solver: || of_force(|place, _| with_drag(place, if place.velocity > 300.0 { 1.2 } else { 1.0 })),
        asked: Measured,
        says: "term:drag, likely, 1.200000: the drag is 1.200000 times the right one above 300.0002 m/s, and right below",
    },
    Told {
        what: "more drag below 300 m/s",
        solver: || of_force(|place, _| with_drag(place, if place.velocity > 300.0 { 1.0 } else { 0.75 })),
        asked: Measured,
        says: "term:drag, likely, 0.750000: the drag is right above 300.0001 m/s, and 0.750000 times the right one below",
    },
    Told {
        what: "drag of another law",
        solver: || of_force(|place, _| with_drag(place, 1.0 + 1.0 / place.velocity)),
        asked: Measured,
        says: "term:drag, likely: the drag is not q V²: over the right one it is 11.591808 at 0.1000 m/s, 1.100552 at 10.0000 m/s and 1.001005 at 1000.0000 m/s; most off is 11.591808 at 0.1000 m/s",
    },
    Told {
        what: "the viscosity is divided by the depth of the exit",
        solver: || altered(|problem| each_stage(problem, |law, exit, _| law.viscosity /= exit), |_, _| ()),
        asked: Measured,
        says: "term:viscosity, likely: alone, up to an exit at L, the viscosity r acts as 1.000 r L^-1 in SI units: it is not made dimensionless as the others, or depends on what it must not",
    },
    Told {
        what: "the static force has half the root of the impact speed as a factor",
        solver: || {
            altered(|problem| each_stage(problem, |law, _, speed| law.static_force *= 0.5 * speed.sqrt()), |_, _| ())
        },
        asked: Measured,
        says: "term:static-force, likely: alone, up to an exit at L, the static force p acts as 0.500 p V0^0.5 in SI units: it is not made dimensionless as the others, or depends on what it must not",
    },
    Told {
        what: "the exit is placed on the chord",
        solver: || Stepping { exit: Placed::OnChord, steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "event-straight, certain: time and velocity at the exit are taken from a straight line through a step, its chord or a tangent",
    },
    Told {
        what: "rest is placed on the chord",
        solver: || Stepping { rest: Placed::OnChord, steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "event-straight, likely: the depth at rest is taken from a straight line through a step: under a constant force its time is right and it is too small",
    },
    Told {
        what: "the velocity at the exit is that of the start of the step",
        solver: || Stepping { exit_speed: |[start, _, _]| start, steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "velocity-stale, likely: V is the same at every exit within a step: that of the start of the step",
    },
    Told {
        what: "the velocity at the exit is that of the end of the step",
        solver: || Stepping { exit_speed: |[_, _, end]| end, steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "exit-velocity-late, likely: V is the same at every exit within a step: that of the end of the step",
    },
    Told {
        what: "twice the steps where all is sixteen times as large",
        solver: || Stepping { steps: |_, speed| (speed * 32.0).powf(0.6).max(1.0), ..RIGHT }.solver(),
        asked: Measured,
        says: "absolute-tolerance, likely: at one relative tolerance the error falls from 3e-2 to 1e-13 as the same flight grows 32768 times in length and speed: the tolerance, or that of an iteration, is an absolute one, whatever is asked for",
    },
    Told {
        what: "weights that add up to 1.02",
        solver: || {
            let [b1, b2, b3, b4] = CLASSICAL.1;
            with_weights([b1, b2 + 0.02, b3, b4]).solver()
        },
        asked: Measured,
        says: "weights, likely, 1.020000: without a force x grows by 1.020000 V t: dx/dt = V has a factor, or the weights of the scheme add up to that",
    },
    Told {
        what: "the last slope is taken at half a step",
        solver: || Stepping { numbers: ([0.5, 0.5, 0.5], CLASSICAL.1), ..FIXED }.solver(),
        asked: Measured,
        says: "scheme-coefficient, certain, 0.833333: the first step under a constant deceleration a has a h² in x with a factor 0.416667, where order 2 has 0.5: as of Runge-Kutta 4 with slope 2 taken at 0.250000 h, not 0.5, or slope 4 taken at 0.500000 h, not 1",
    },
    Told {
        what: "the weight of the first slope is 1/3",
        solver: || Stepping { is_fixed: true, ..with_weights([1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]) }.solver(),
        asked: Measured,
        says: "scheme-coefficient, certain, 1.166667: the first step under a constant deceleration a has a h in V with a factor 1.166667, where order 1 has 1: as of Runge-Kutta 4 with a weight of 0.333333 for slope 1, not 0.166667",
    },
    Told {
        what: "the second slope is taken at 0.4 of the step",
        solver: || Stepping { numbers: ([0.4, 0.5, 1.0], CLASSICAL.1), ..FIXED }.solver(),
        asked: Claiming(4.0),
        says: "scheme-coefficient, certain, 0.933333: the first step under a constant deceleration a has a h² in x with a factor 0.466667, where order 2 has 0.5: as of Runge-Kutta 4 with slope 2 taken at 0.400000 h, not 0.5, or slope 4 taken at 0.800000 h, not 1",
    },
    Told {
        what: "the step that lands on an end lasts the distance over V at its start",
        solver: || Stepping { exit: Placed::AtFirstSpeed, stage_end: Placed::AtFirstSpeed, ..FIXED }.solver(),
        asked: Claiming(4.0),
        says: "event-straight, certain: the step that lands on an end lasts the distance to it over V at the start of the step: the time and V there have an order that the steps do not have",
    },
    Told {
        what: "at rest below a thousandth of V0, in fixed steps",
        solver: || Stepping { rest_speed: 1e-3, ..FIXED }.solver(),
        asked: Questions(40),
        says: "failed | rest-threshold, certain: the projectile counts as at rest below 0.00100000 V0",
    },
    Told {
        what: "half of the first step behind the end of a stage",
        solver: || Stepping { restart: 0.5, ..FIXED }.solver(),
        asked: Measured,
        says: "start-kick, certain: the first step behind the end of a stage has a h in V with a factor 0.500000, not 1, whatever the force before: it is not started as the first step of all is",
    },
    Told {
        what: "the V in the force is a third of a step ahead",
        solver: || Stepping { lag: [0.0, -1.0 / 3.0], ..FIXED }.solver(),
        asked: Claiming(4.0),
        says: "scheme-coefficient, certain, 1.333333: the first step under V' = z V/h gives V the term 0.666667 z^2, where order 2 has 0.500000 z^2",
    },
    Told {
        what: "part of the force acts for the step asked for, where it is shortened to land",
        solver: || {
            by_request(
                |_, _| (),
                |request, problem, end| {
                    let left_over = request.dt_s.map_or(0.0, |step| (step - end.time).max(0.0));
                    end.velocity -= 0.5 * problem.stages[0].force(0.0, 1.0) * left_over / problem.mass;
                },
            )
            .in_fixed_steps()
        },
        asked: Measured,
        says: "scheme-coefficient, certain, 0.500000: where a step under a constant deceleration a is shortened to land on an end, V is 0.500000 a smaller for each second of the step asked for: part of its force acts for as long as a whole step",
    },
    Told {
        what: "the depth in the force is that of the start of the step, at a tolerance",
        solver: || Stepping { lag: [1.0, 0.0], ..RIGHT }.solver(),
        asked: Measured,
        says: "scheme-coefficient, likely: the first step under stiffness alone, V' = -z² x/h², gives V the term 0.000000 (-z)^2, where order 2 has -0.500000 (-z)^2, and without stiffness it is right: the x in the force is that of another time, or another term of its series",
    },
    Told {
        what: "the force of the stage before in the first slope",
        solver: || Stepping { stale: 1.0, ..FIXED }.solver(),
        asked: Measured,
        says: "force-stale, certain: the first step behind the end of a stage has a h in V with a factor 0.833333, not 1: part of its force is that of the stage before",
    },
    Told {
        what: "half of the velocity in the force is that of the start of the step",
        solver: || Stepping { lag: [0.0, 0.5], ..FIXED }.solver(),
        asked: Claiming(4.0),
        says: "drag-lagged, likely: the first step under V' = z V/h gives V the term 0.250000 z^2, where order 2 has 0.500000 z^2: the V in the force is that of another time, or a weight is wrong",
    },
    Told {
        what: "a scheme of three steps is started by Euler's",
        solver: || Scheme::Adams(ADAMS, true).solver(),
        asked: Claiming(3.0),
        says: "start-low-order, certain: the first 2 steps of a flight have order 1, and later ones 3: a scheme of several steps is started by one of too low an order",
    },
    Told {
        what: "a scheme of three steps takes the slope of the last one twice",
        solver: || Scheme::Adams([ADAMS[0], ADAMS[1] + ADAMS[2], 0.0], false).solver(),
        asked: Claiming(3.0),
        says: "scheme-coefficient, certain: the last slopes have the weights 1.9167, -0.9167, the newest first, where Adams and Bashforth's scheme of order 3 has 1.9167, -1.3333, 0.4167",
    },
    Told {
        what: "a scheme of three steps that is right",
        solver: || Scheme::Adams(ADAMS, false).solver(),
        asked: Claiming(3.0),
        says: "",
    },
    Told {
        what: "a corrector of order 3 adds the slope that it must take off",
        solver: || Scheme::Corrected([MOULTON[0], MOULTON[1], -MOULTON[2]]).solver().claiming(3.0),
        asked: Questions(120),
        says: "failed | scheme-coefficient, certain: the weight of slope 2 (the newest is 1) is 0.0833, not -0.0833, in the corrector of order 3 behind a predictor of order 3",
    },
    Told {
        what: "a corrector of order 3 that is right",
        solver: || Scheme::Corrected(MOULTON).solver(),
        asked: Claiming(3.0),
        says: "",
    },
    Told {
        what: "nothing, by a force that is linear in V in each step",
        solver: || Linear::Times(1.0).solver(),
        asked: Questions(120),
        says: "passed | ",
    },
    Told {
        what: "nothing, by the same, measured",
        solver: || Linear::Times(1.0).solver(),
        asked: Claiming(2.0),
        says: "",
    },
    Told {
        what: "a Jacobian lacks the drag, and no order is claimed",
        solver: || Linear::WithoutDrag.solver(),
        asked: Questions(120),
        says: "passed | drag-lagged, likely: the order falls to 1 where there is drag, and not with viscosity alone: its V², or a derivative of it, is that of another time",
    },
    Told {
        what: "the linear part of a force has the factor 1.0002",
        solver: || Linear::Times(1.0002).solver(),
        asked: Claiming(2.0),
        says: "scheme-coefficient, likely: one step of a time h has an error of 9.973e-5 h^2 in V, and so the order 1 in place of 2, under viscosity alone, V' = -V: so small an error is as that of a number with too few digits",
    },
    Told {
        what: "a Jacobian lacks the drag",
        solver: || Linear::WithoutDrag.solver(),
        asked: Claiming(2.0),
        says: "scheme-coefficient, likely: one step of a time h has an error of -9.960e-1 h^2 in V, and so the order 1 in place of 2, under drag alone, V' = -V²: V² in the force is that of another time, or a derivative of it is wrong, as in a Jacobian",
    },
    Told {
        what: "a Jacobian is that of the start of the stage",
        solver: || Linear::OfStageStart.solver(),
        asked: Claiming(2.0),
        says: "drag-lagged, likely: under drag alone the first step has the order 2, and later ones 1: what a step takes from the drag, such as a linear part, is that of the start of the stage",
    },
    Told {
        what: "static force and spring are applied before viscosity and drag",
        solver: || Linear::OneByOne.solver().claiming(2.0),
        asked: Questions(120),
        says: "failed | scheme-coefficient, likely: one step of a time h has an error of 4.987e-1 h^2 in V, and so the order 1 in place of 2, under a static force and viscosity, V' = -1 - V: each is applied by itself, one after the other",
    },
    Told {
        what: "backward differences have half of the new slope, not two thirds",
        solver: || Scheme::Backward(0.5).solver().claiming(2.0),
        asked: Questions(120),
        says: "failed | scheme-coefficient, certain: the weight of the new slope is 0.5000, not 0.6667, in the backward differences of order 2",
    },
    Told {
        what: "backward differences that are right",
        solver: || Scheme::Backward(2.0 / 3.0).solver(),
        asked: Claiming(2.0),
        says: "",
    },
    Told {
        what: "backward differences with a viscosity that grows with the mass",
        solver: || {
            stepwise(|problem, h| {
                let mut problem = problem.clone();
                let factor = 1.0 + 0.3 * problem.mass / (1.0 + problem.mass);
                problem.stages.iter_mut().for_each(|law| law.viscosity *= factor);
                Scheme::Backward(2.0 / 3.0).end(&problem, h)
            })
            .claiming(2.0)
        },
        asked: Questions(120),
        says: "failed | unknown, possible: no cause that is known explains the failing answers; the smallest that fails is viscosity-1 (viscosity, exit); `viscosity` stands in 100 % of the failing and 2 % of the passing questions",
    },
    Told {
        what: "a step that passes the end of a stage is taken whole",
        solver: || stepwise(|problem, h| Passing::Whole.end(problem, h)),
        asked: Questions(120),
        says: "passed | stage-end-late, certain: steps do not land on the ends of stages: where the force jumps the order falls to 1",
    },
    Told {
        what: "the end of a stage is missed in the step that reaches the exit",
        solver: || stepwise(|problem, h| Passing::WholeAtExit.end(problem, h)),
        asked: Claiming(2.0),
        says: "stage-end-missed, certain: the end of a stage is missed in the step that reaches the exit: that step has the force before it",
    },
    Told {
        what: "an iteration ends once V changes by a thousandth",
        solver: || Scheme::Midpoint(1e-3).solver(),
        asked: Claiming(2.0),
        says: "iteration-loose, certain: a step that changes V by a part of 2.0e-3 or less has order 1, and one that changes it by more has a higher order: an iteration within the step ends once it changes little",
    },
    Told {
        what: "an iteration ends once V changes by a millionth, behind the second pass at least",
        solver: || Scheme::Gauss(1e-6).solver(),
        asked: Claiming(4.0),
        says: "iteration-loose, certain: a step that changes V by a part of 1.1e-3 or less has order 2, and one that changes it by more has a higher order: an iteration within the step ends once it changes little",
    },
    Told {
        what: "an iteration of two slopes goes on until they stay",
        solver: || Scheme::Gauss(1e-15).solver(),
        asked: Claiming(4.0),
        says: "",
    },
    Told {
        what: "an iteration goes on until V stays",
        solver: || Scheme::Midpoint(1e-15).solver(),
        asked: Claiming(2.0),
        says: "",
    },
    Told {
        what: "an event is looked for by eight halvings of a step",
        solver: || Stepping { halvings: 8, ..FIXED }.solver(),
        asked: Claiming(4.0),
        says: "event-loose, certain: every exit lies at a whole number of parts of a step, each 2^-8 of it: a step is halved 8 times to find it, and no more",
    },
    Told {
        what: "a flight is given up after a time by V0, and its exit called reached",
        solver: || {
            altered(|_| (), |problem, end| end.time = end.time.min(1.25 * problem.exit_depth / problem.impact_speed))
        },
        asked: Measured,
        says: "flight-cut-short, likely, 1.250000: the time at an exit is 1.250000 times its depth over V0, whatever the force: the flight is cut short there",
    },
    Told {
        what: "x in s x is counted from the start of the stage, by a solver that errs more in flights through one stage",
        solver: || {
            altered(
                |problem| {
                    for index in 1..problem.stages.len() {
                        let start = problem.start_of(index);
                        let law = &mut problem.stages[index];
                        law.static_force -= law.stiffness * start;
                    }
                },
                |problem, end| {
                    if problem.stages.len() == 1 {
                        end.time *= 1.0 + 9e-10;
                    }
                },
            )
        },
        asked: Questions(80),
        says: "failed | stiffness-origin, certain: the depth in s x is counted from the start of the stage, not from the impact face",
    },
    Told {
        what: "steps go over the ends of stages",
        solver: || Stepping { stage_end: Placed::AtStepEnd, ..FIXED }.solver(),
        asked: Claiming(4.0),
        says: "stage-end-late, certain: steps do not land on the ends of stages: where the force jumps the order falls to 1",
    },
    Told {
        what: "V0 is taken for V half a step before the impact",
        solver: || started(0.5),
        asked: Measured,
        says: "start-kick, certain: under a constant deceleration a, V is 0.500000 a h too small from the start on, whatever the step h: V0 is taken for V half a step before the impact",
    },
    Told {
        what: "V0 is taken for V a tenth of a step before the impact",
        solver: || started(0.1),
        asked: Measured,
        says: "start-kick, certain: under a constant deceleration a, V is 0.100000 a h too small from the start on, whatever the step h",
    },
    Told { what: "V0 is what it is", solver: || started(0.0), asked: Measured, says: "" },
    Told {
        what: "a velocity that is reported so is none of the flight: its time is right",
        solver: || {
            by_request(
                |_, _| (),
                |request, problem, end| {
                    let deceleration = problem.stages[0].force(0.0, problem.impact_speed) / problem.mass;
                    let start = problem.impact_speed - 0.5 * request.dt_s.unwrap_or(0.0) * deceleration;
                    end.velocity = (start * start - 2.0 * deceleration * end.depth).max(0.0).sqrt();
                },
            )
            .in_fixed_steps()
        },
        asked: Measured,
        says: "",
    },
    Told {
        what: "a shortened step takes half the time of a whole one: what one step takes says nothing there",
        solver: || Stepping { clock: |_, whole, _| 0.5 * whole, ..FIXED }.solver(),
        asked: Measured,
        says: "",
    },
    Told {
        what: "nothing, in fixed steps, by questions",
        solver: || FIXED.solver(),
        asked: Questions(40),
        says: "passed | ",
    },
    Told {
        what: "a shortened step counts as a whole one",
        solver: || Stepping { clock: |_, whole, _| whole, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | event-time-late, likely: the time alone has order 1: it is that of the end of a step",
    },
    Told {
        what: "a shortened step takes no time",
        solver: || Stepping { clock: |_, _, _| 0.0, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | event-time-early, likely: the time alone has order 1, and is too small: that of a shortened step is not counted",
    },
    Told {
        what: "a scheme of order three whose flights end with a step",
        solver: || {
            Stepping { exit: Placed::AtStepEnd, rest: Placed::AtStepEnd, stage_end: Placed::AtStepEnd, ..KUTTA }
                .solver()
        },
        asked: Questions(40),
        says: "passed | exit-late, certain: every flight ends at the end of a step: exit and rest are not located, order 1",
    },
    Told {
        what: "boundaries are passed at the end of a step",
        solver: || Stepping { exit: Placed::AtStepEndByDepth, stage_end: Placed::AtStepEndByDepth, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | stage-end-late, likely: the order falls to 1 at ends of stages and at the exit: a step that passes one is taken whole",
    },
    Told {
        what: "the exit is passed at the end of a step",
        solver: || Stepping { exit: Placed::AtStepEndByDepth, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | exit-late, likely: the order falls to 1 at the exit",
    },
    Told {
        what: "the ends of stages are passed at the end of a step",
        solver: || Stepping { stage_end: Placed::AtStepEnd, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | stage-end-late, certain: steps do not land on the ends of stages: where the force jumps the order falls to 1",
    },
    Told {
        what: "rest is taken at the end of a step",
        solver: || Stepping { rest: Placed::AtStepEnd, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | event-time-late, likely: the time alone has order 1: it is that of the end of a step",
    },
    Told {
        what: "the velocity in the force is that of the start of the step",
        solver: || Stepping { lag: [0.0, 1.0], ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | drag-lagged, likely: the order falls to 1 where the force depends on V",
    },
    Told {
        what: "the depth in the force is that of the start of the step",
        solver: || Stepping { lag: [1.0, 0.0], ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | force-stale, likely: the order falls to 1 where the force depends on x: its depth is that of another time",
    },
    Told {
        what: "both are",
        solver: || Stepping { lag: [1.0, 1.0], ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | drag-lagged, certain: the first step under V' = z V/h gives V the term 0.000000 z^2, where order 2 has 0.500000 z^2: the V in the force is that of the start of the step",
    },
    Told {
        what: "V0 is taken for V half a step before the impact, by the classical scheme",
        solver: || Stepping { kick: 0.5, ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | start-kick, likely: the order falls to 1 where there is a force at impact: V half a step back is V0 itself",
    },
    Told {
        what: "Heun's scheme claims order four",
        solver: || Stepping { numbers: HEUN, ..FIXED }.solver().claiming(4.0),
        asked: Questions(40),
        says: "failed | scheme-coefficient, certain, 0.000000: the first step under V' = z V/h gives V the term 0.000000 z^3, where order 3 has 0.166667 z^3",
    },
    Told {
        what: "Heun's scheme claims order two",
        solver: || Stepping { numbers: HEUN, ..FIXED }.solver().claiming(2.0),
        asked: Questions(40),
        says: "passed | ",
    },
    Told {
        what: "forward Euler",
        solver: || Stepping { numbers: (CLASSICAL.0, [1.0, 0.0, 0.0, 0.0]), ..FIXED }.solver(),
        asked: Questions(40),
        says: "passed | first-order-scheme, certain: the scheme is forward Euler, of order 1",
    },
    Told {
        what: "weights of a quarter each, of order two",
        solver: || Stepping { is_fixed: true, ..with_weights([0.25, 0.25, 0.25, 0.25]) }.solver(),
        asked: Questions(40),
        says: "passed | ",
    },
    Told {
        what: "the step is 0.1 ms whatever is asked for",
        solver: || Stepping { step: |_| 1e-4, ..KUTTA }.solver(),
        asked: Questions(24),
        says: "failed | step-ignored, certain: answers are the same whatever the step: dt_s is ignored",
    },
    Told {
        what: "no step is below a millisecond",
        solver: || Stepping { step: |step| step.max(1e-3), ..KUTTA }.solver(),
        asked: Questions(40),
        says: "failed | step-ignored, likely: answers at steps below 1e-3 s are the same: there is a least step",
    },
    Told {
        what: "the flight ends after 100 steps",
        solver: || {
            central(|step, problem, flight| {
                if let Ok(whole) = Taylor::default().solve(&problem.clone().with_exit(f64::INFINITY), Detail::End)
                    && whole.end.time > 100.0 * step
                {
                    flight.end.time = 100.0 * step;
                    flight.end.depth *= 0.5;
                    flight.outcome = Outcome::Stopped;
                }
            })
        },
        asked: Questions(40),
        says: "failed | flight-cut-short, likely: the flight ends after 100 steps, wherever it is",
    },
    Told {
        what: "a sum in single precision",
        solver: || {
            central(|step, _, flight| {
                let steps = (flight.end.time / step) as usize;
                let sum = (0..steps).fold(0.0_f32, |sum, _| sum + step as f32);
                flight.end.time += f64::from(sum) - steps as f64 * step;
            })
        },
        asked: Questions(40),
        says: "failed | round-off, likely: the error of the time does not fall below 2e-4 with the step: round-off far above that of 64-bit numbers, as of a sum in single precision",
    },
    Told {
        what: "central difference with twice the drag",
        solver: || {
            let solver = Answering::plain(|request| {
                let mut problem = request.problem(None);
                problem.stages.iter_mut().for_each(|law| law.drag *= 2.0);
                let flight = CentralDifference::uniform(request.dt_s?, VelocityAt::LaggedHalfStep, Boundaries::StepEnd)
                    .solve(&problem, Detail::End)
                    .ok()?;
                Some(answer(flight.outcome, flight.end))
            });
            solver.in_fixed_steps()
        },
        asked: Questions(24),
        says: "failed | term:drag, certain, 2.000000: the drag q is 2 times the right one",
    },
    Told {
        what: "the classical scheme with a tenth more drag",
        solver: || {
            Stepping { read: |problem| problem.stages.iter_mut().for_each(|law| law.drag *= 1.1), ..FIXED }.solver()
        },
        asked: Questions(24),
        says: "failed | term:drag, certain, 1.100000: the drag q is 1.10000 times the right one",
    },
    Told {
        what: "the classical scheme without viscosity",
        solver: || {
            Stepping { read: |problem| problem.stages.iter_mut().for_each(|law| law.viscosity = 0.0), ..FIXED }.solver()
        },
        asked: Questions(24),
        says: "failed | term:viscosity, certain, 0.000000: the viscosity r is left out",
    },
    Told {
        what: "the classical scheme with a spring counted from the stage",
        solver: || {
            Stepping {
                read: |problem| {
                    (1..problem.stages.len()).for_each(|i| {
                        problem.stages[i].static_force -= problem.stages[i].stiffness * problem.start_of(i);
                    });
                },
                ..FIXED
            }
            .solver()
        },
        asked: Questions(24),
        says: "failed | stiffness-origin, likely: the depth in s x is counted from the start of the stage, not from the impact face",
    },
    Told {
        what: "the velocity at exits is a hundredth too great, by a scheme of order three",
        solver: || {
            let solver = Answering::plain(|request| {
                let problem = request.problem(None);
                let mut end = KUTTA.end(&problem, request.dt_s?)?;
                end.velocity *= 1.01;
                Some(answer(exact(&problem)?.outcome, end))
            });
            solver.in_fixed_steps()
        },
        asked: Questions(24),
        says: "failed | unit:velocity, certain, 1.010000: the velocity reported is 1.010000 times the right one",
    },
    Told {
        what: "the velocity listed at the end of a stage is that at its start",
        solver: || {
            listing_in_steps(VelocityAt::PredictedHalfStep, Boundaries::Landed, |problem, events| {
                let mut before = problem.impact_speed;
                for Event { state, .. } in events.iter_mut().filter(|event| !is_end(event)) {
                    std::mem::swap(&mut before, &mut state.velocity);
                }
            })
        },
        asked: Questions(24),
        says: "failed | event-list, certain: every end is right, and the events listed are not: the event listed is off: crater-end velocity goes to a limit that is off by +2.69e-2",
    },
    Told {
        what: "ends of stages are left out of the events, in fixed steps",
        solver: || {
            listing_in_steps(VelocityAt::PredictedHalfStep, Boundaries::Landed, |_, events| events.retain(is_end))
        },
        asked: Questions(24),
        says: "failed | event-list, certain: every end is right, and the events listed are not: lists events, and not the crater-end at x = 0.038040821 m",
    },
    Told {
        what: "events are listed twice, in fixed steps",
        solver: || {
            listing_in_steps(VelocityAt::LaggedHalfStep, Boundaries::Interpolated, |_, events| {
                events.extend_from_within(..);
            })
        },
        asked: Questions(24),
        says: "failed | event-list, certain: every end is right, and the events listed are not: the events listed are not of the stages, each once, in the order of time",
    },
    Told {
        what: "nothing, in fixed steps that go over the events listed",
        solver: || listing_in_steps(VelocityAt::LaggedHalfStep, Boundaries::StepEnd, |_, _| ()),
        asked: Questions(40),
        says: "passed | drag-lagged, certain: the force is evaluated with V half a step behind: order 1 wherever it depends on V",
    },
    Told {
        what: "nothing, in fixed steps with events in between",
        solver: || listing_in_steps(VelocityAt::PredictedHalfStep, Boundaries::Interpolated, |_, _| ()),
        asked: Questions(40),
        says: "passed | ",
    },
    Told {
        what: "pi is 3.1416 in the time to rest in a spring",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    let stage = problem.stages.iter().position(|law| end.depth < law.end).unwrap_or(0);
                    let Stage { static_force, stiffness, viscosity, drag, .. } = problem.stages[stage];
                    if end.velocity == 0.0 && stiffness > 0.0 && static_force == 0.0 && viscosity == 0.0 && drag == 0.0
                    {
                        end.time += 0.5 * (31_416.0 / 1e4 - std::f64::consts::PI) * (problem.mass / stiffness).sqrt();
                    }
                },
            )
        },
        asked: Questions(60),
        says: "failed | stage-wrong, likely, 1.000002: the flight through a stage, from the solver's state at its start, has a wrong time alone, 1.000002 times the right one, where it is without a static force and the flight comes to rest in it: 15 of 15 such passages, and none of the 90 others",
    },
    Told {
        what: "the clock goes on in steps that are rejected",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    if !is_steady(problem) {
                        delay(end);
                    }
                },
            )
        },
        asked: Questions(12),
        says: "failed | clock, likely: the time alone is wrong, and late, and under a constant force it is right: the clock goes on in steps that are rejected",
    },
    Told {
        what: "the clock goes on by steps that are another length than those of the path",
        solver: || altered(|_| (), |_, end| end.time *= 1.1 + 0.01 * end.depth),
        asked: Questions(60),
        says: "failed | clock, likely: the time alone is wrong, also where there is no force, and changes smoothly from exit to exit: the clock goes on by other lengths than those of the steps",
    },
    Told {
        what: "the time is summed by a rule of a lower order than the path",
        solver: || altered(|_| (), |problem, end| end.time *= 1.2 - 0.2 * end.velocity / problem.impact_speed),
        asked: Questions(60),
        says: "failed | clock, likely: the time alone is wrong, and changes smoothly from exit to exit: it is summed over the steps by a rule of a lower order than that of the path",
    },
    Told {
        what: "events are late",
        solver: || altered(|_| (), |_, end| delay(end)),
        asked: Questions(60),
        says: "failed | event-time-late, likely: only the time is wrong, and late, as that of the end of a step, or of a clock that goes on by more than its steps",
    },
    Told {
        what: "no answer at the tightest tolerance where there is a gap",
        solver: || {
            Answering::plain(|request| {
                let problem = request.problem(None);
                let has_gap = problem.stages.iter().any(|stage| *stage == Stage { end: stage.end, ..Stage::free() });
                let flight = exact(&problem)?;
                (!has_gap || request.rtol > super::super::TOLERANCES[2]).then(|| answer(flight.outcome, flight.end))
            })
        },
        asked: AtEdges(24),
        says: "failed | no-answer, likely: 3 questions have no answer: reports an error: it never ends; all of them hold `air-gap`",
    },
    Told {
        what: "rest below 0.1 m/s, with round-off left where the flight begins so slow",
        solver: || {
            by_rules(Rules { rest_speed: 0.1, ..Rules::default() }, |end| {
                let State { time, depth, .. } = *end;
                *end = State { time: time.max(1e-31), depth: depth.max(1e-33), velocity: 0.0 };
            })
        },
        asked: AtEdges(12),
        says: "failed | rest-threshold, certain, 0.100000: the projectile counts as at rest below 0.100000 m/s",
    },
    Told {
        what: "S by another formula",
        solver: || with_s(82.6, -0.544, |_| ()),
        asked: Questions(60),
        says: "failed | parameter:S, certain: S by Eq. 14 is that of another formula: 82.6 (fc/MPa)^-0.544",
    },
    Told {
        what: "S falls with the power 0.4 of fc",
        solver: || with_s(72.0, -0.4, |_| ()),
        asked: Questions(12),
        says: "failed | parameter:S, certain: S by Eq. 14 holds (fc/MPa)^-0.400000, not ^-0.5",
    },
    Told {
        what: "S of Eq. 14 with 70",
        solver: || with_s(70.0, -0.5, |_| ()),
        asked: Questions(60),
        says: "failed | parameter:S, certain, 0.972222: S by Eq. 14 is 0.9722222 times the right one; 0.001 is a strength in Pa",
    },
    Told {
        what: "nothing, as a reader of scenes",
        solver: || of_scene(|_| ()),
        asked: Questions(60),
        says: "passed | ",
    },
    Told {
        what: "B a fifth too great",
        solver: || of_scene(|scene| scene.inertia_factor *= 1.2),
        asked: Questions(60),
        says: "failed | parameter:density, certain, 1.200000: density, nose factor or B, which act as one product, is 1.20000 times the right one",
    },
    Told {
        what: "the density in g/cm³",
        solver: || of_scene(|scene| scene.density_kg_m3 *= 1e-3),
        asked: Questions(60),
        says: "failed | parameter:density, certain, 0.001000: density, nose factor or B, which act as one product, is 0.00100000 times the right one",
    },
    Told {
        what: "the strength a tenth too great, and not in S",
        solver: || of_scene(|scene| scene.strength_pa *= 1.1),
        asked: Questions(60),
        says: "failed | parameter:S, certain, 1.100000: S, or the strength it multiplies, is 1.10000 times the right one",
    },
    Told {
        what: "the radius for the diameter",
        solver: || of_scene(|scene| scene.diameter_m *= 0.5),
        asked: Questions(60),
        says: "failed | parameter:diameter, certain, 0.500000: the diameter is 0.500000 times the right one",
    },
    Told {
        what: "k half a diameter too great",
        solver: || of_scene(|scene| scene.crater_ratio += 0.5),
        asked: Questions(60),
        says: "failed | parameter:k, certain: k is 0.500000 too great",
    },
    Told {
        what: "twice the c that is given",
        solver: || of_scene(|scene| scene.crater_stiffness_n_m = scene.crater_stiffness_n_m.map(|c| 2.0 * c)),
        asked: Questions(60),
        says: "failed | parameter:crater-stiffness, certain, 2.000000: c is 2 times the right one where it is stated",
    },
    Told {
        what: "every nose is flat",
        solver: || of_scene(|scene| scene.nose_factor = 1.0),
        asked: Questions(60),
        says: "failed | parameter:nose-factor, certain: the nose factor is left out: N* = 1",
    },
    Told {
        what: "the thickness in whole mm",
        solver: || of_scene(|scene| scene.thickness_m = scene.thickness_m.map(|h| (1e3 * h).round() * 1e-3)),
        asked: Questions(60),
        says: "failed | input-rounded, likely: the thickness is rounded to a multiple of 0.00100000 m",
    },
    Told {
        what: "the far side at H, whatever the criterion",
        solver: || of_scene(|scene| "full-depth".clone_into(&mut scene.criterion)),
        asked: Questions(60),
        says: "failed | parameter:criterion, certain: the criterion is ignored: the exit is the far side",
    },
    Told {
        what: "S by a formula that nobody knows",
        solver: || with_s(60.0, -0.3, |_| ()),
        asked: Questions(60),
        says: "failed | stage-wrong, likely: the flight through a stage, from the solver's state at its start, has a wrong depth and time where S follows from the strength and c follows from the other numbers: 15 of 15 such passages, and none of the 32 others",
    },
    Told {
        what: "the clock goes on from the last exit",
        solver: || {
            Answering::new(|| {
                let clock = Cell::new(0.0);
                move |request: &PeerRequest| {
                    let mut flight = exact(&request.problem(None))?;
                    flight.end.time += clock.get();
                    clock.set(if flight.end.velocity > 0.0 { flight.end.time } else { 0.0 });
                    Some(answer(flight.outcome, flight.end))
                }
            })
        },
        asked: AtEdges(60),
        says: "failed | state-kept, certain: answers depend on what was asked before: 5 of 5 failing questions are answered otherwise by a solver that has just started",
    },
    Told {
        what: "another answer each time",
        solver: || {
            let asked = std::rc::Rc::new(Cell::new(0_u32));
            Answering::new(move || {
                let asked = asked.clone();
                move |request: &PeerRequest| {
                    asked.set(asked.get() + 1);
                    let mut flight = exact(&request.problem(None))?;
                    flight.end.time *= 1.0 + 1e-3 * f64::from(asked.get()).sin();
                    Some(answer(flight.outcome, flight.end))
                }
            })
        },
        asked: Questions(60),
        says: "failed | not-repeatable, certain: answers are not the same twice: 5 of 5 failing questions are answered otherwise when they are asked again",
    },
    Told {
        what: "answers at loose tolerances are a hundredth off, and tight ones right",
        solver: || {
            by_request(
                |_, _| (),
                |request, _, end| {
                    if request.rtol > 1e-8 {
                        end.time *= 1.01;
                        end.depth *= 1.01;
                    }
                },
            )
        },
        asked: Questions(12),
        says: "failed | unknown, possible: no cause that is known explains the failing answers; the smallest that fails is static-force-1 (static-force, exit); `exit` stands in 67 % of the failing and 0 % of the passing questions",
    },
    Told {
        what: "no tolerance below 1e-8",
        solver: || by_request(|_, _| (), |request, _, end| end.time *= 1.0 + 0.03 * request.rtol.max(1e-8)),
        asked: Questions(40),
        says: "passed | tolerance-ignored, likely: answers at tolerances of 1e-9 and 1e-12 are as good as the same, with errors up to 3e-10",
    },
    Told {
        what: "nothing: errors of many tolerances fall with them",
        solver: || by_request(|_, _| (), |request, _, end| end.time *= 1.0 + 100.0 * request.rtol),
        asked: Questions(40),
        says: "passed | ",
    },
    Told {
        what: "a time that is off by up to 1e-5 at every tolerance",
        solver: || by_request(|_, _| (), |_, _, end| end.time *= 1.0 + 1e-5 * (1e3 * end.depth).sin()),
        asked: Questions(60),
        says: "failed | tolerance-ignored, likely: answers are the same at every tolerance, and err by more than it allows",
    },
    Told {
        what: "errors of the tolerance to the power of 0.6",
        solver: || {
            by_request(|_, _| (), |request, _, end| end.time *= 1.0 + request.rtol.powf(0.6) * (1e3 * end.depth).sin())
        },
        asked: Questions(12),
        says: "failed | tolerance-missed, likely: errors of 1e-4, 2e-6 and 3e-8, in the time alone, at tolerances of 1e-6, 1e-9 and 1e-12: they fall as the tolerance to the power of 0.6, as with a wrong coefficient of the scheme, or events that are located less accurately than steps are taken",
    },
    Told {
        what: "steps by an estimate of their error that is too small",
        solver: || Stepping { steps: |rtol, _| 3.0 * rtol.powf(-1.0 / 12.0), ..RIGHT }.solver(),
        asked: Questions(24),
        says: "failed | steps-too-long, likely: flights that fail are right in parts: errors of 1e0 as a whole, 9e-12 in 8 and 9e-15 in 64 parts. The force is right, and steps are too long: the estimate of their error is wrong, or a coefficient of the scheme",
    },
    Told {
        what: "answers kept by mass, speed and exit, whatever the stages",
        solver: || {
            Answering::new(|| {
                let mut kept: Vec<(PeerRequest, PeerAnswer)> = Vec::new();
                move |request: &PeerRequest| {
                    let is_same = |(known, _): &&(PeerRequest, PeerAnswer)| {
                        (known.mass_kg, known.velocity_m_s, known.exit_depth_m, known.rtol)
                            == (request.mass_kg, request.velocity_m_s, request.exit_depth_m, request.rtol)
                    };
                    if let Some((_, known)) = kept.iter().find(is_same) {
                        return Some(known.clone());
                    }
                    let flight = exact(&request.problem(None))?;
                    let answer = answer(flight.outcome, flight.end);
                    kept.push((request.clone(), answer.clone()));
                    Some(answer)
                }
            })
        },
        asked: Questions(60),
        says: "failed | input-kept, likely: where the stages alone differ from the question before, the answer is the one given there",
    },
    Told {
        what: "errors of a thousand tolerances, and no more",
        solver: || {
            by_request(|_, _| (), |request, _, end| end.time *= 1.0 + 1e4 * request.rtol * (1e3 * end.depth).sin())
        },
        asked: Questions(60),
        says: "failed | tolerance-missed, likely: errors of 5e-3, 5e-6 and 5e-9, in the time alone, at tolerances of 1e-6, 1e-9 and 1e-12: the error is not what the tolerance asks for",
    },
    Told {
        what: "arithmetic in single precision",
        solver: || {
            by_request(
                |_, _| (),
                |request, _, end| end.time *= 1.0 + 1e-7 * (1e5 * end.depth + request.rtol.ln()).sin(),
            )
        },
        asked: Questions(12),
        says: "failed | single-precision, likely: errors of 5e-8, 4e-8 and 8e-8, in the time alone, at tolerances of 1e-6, 1e-9 and 1e-12: they stop falling far above the round-off of 64-bit numbers",
    },
    Told {
        what: "numbers of single precision",
        solver: || {
            altered(
                |_| (),
                |_, end| {
                    *end = State {
                        time: f64::from(end.time as f32),
                        depth: f64::from(end.depth as f32),
                        velocity: f64::from(end.velocity as f32),
                    }
                },
            )
        },
        asked: Questions(60),
        says: "failed | single-precision, certain: every number is one of single precision (f32)",
    },
    Told {
        what: "times of six digits",
        solver: || altered(|_| (), |_, end| end.time = rounded(end.time, 5)),
        asked: Questions(60),
        says: "failed | output-rounded, certain: the time reported is rounded to 6 digits",
    },
    Told {
        what: "depths of six decimals",
        solver: || altered(|_| (), |_, end| end.depth = (1e6 * end.depth).round() / 1e6),
        asked: Questions(60),
        says: "failed | output-rounded, certain: the depth reported is rounded to a multiple of 1.00000e-6 m",
    },
    Told {
        what: "drag is a tenth less at loose tolerances",
        solver: || {
            by_request(
                |request, problem| {
                    problem.stages.iter_mut().filter(|_| request.rtol > 1e-7).for_each(|law| law.drag *= 0.9);
                },
                |_, _, _| (),
            )
        },
        asked: Questions(60),
        says: "failed | unknown, possible: no cause that is known explains the failing answers; the smallest that fails is drag-1 (drag, exit); `drag` stands in 100 % of the failing and 19 % of the passing questions",
    },
    Told {
        what: "half the drag, and times in ms",
        solver: || {
            altered(|problem| problem.stages.iter_mut().for_each(|law| law.drag *= 0.5), |_, end| end.time *= 1e3)
        },
        asked: Questions(60),
        says: "failed | term:drag, certain, 0.500000: the drag q is 0.500000 times the right one",
    },
    Told {
        what: "no drag in stages that drive",
        solver: || {
            altered(
                |problem| problem.stages.iter_mut().filter(|law| law.static_force < 0.0).for_each(|law| law.drag = 0.0),
                |_, _| (),
            )
        },
        asked: Questions(60),
        says: "failed | term:drag, likely, 0.000000: the flight through a stage, from the solver's state at its start, is that without the drag q: 8 of 8 wrong passages",
    },
    Told {
        what: "P grows with the impact speed",
        solver: || altered(|problem| problem.stages[0].static_force *= 1.0 + 1e-3 * problem.impact_speed, |_, _| ()),
        asked: Questions(60),
        says: "failed | stage-wrong, likely: the flight through a stage, from the solver's state at its start, has a wrong time and velocity where it has a static force and it is the first: 27 of 27 such passages, and none of the 78 others",
    },
    Told {
        what: "viscosity of 1 Ns/m is left out",
        solver: || {
            altered(
                |problem| {
                    let mass = problem.mass;
                    problem.stages.iter_mut().filter(|law| law.viscosity < mass).for_each(|law| law.viscosity = 0.0);
                },
                |_, _| (),
            )
        },
        asked: Questions(60),
        says: "failed | term:viscosity, likely, 0.000000: the flight through a stage, from the solver's state at its start, is that without the viscosity r where it has a static force and a spring and viscosity and drag alone and its time is above a number from 4.336e-2 to 4.370e-2 s: 8 of 8 wrong passages",
    },
    Told {
        what: "the last event is another end than the one reported",
        solver: || {
            listing(|_, said| {
                said.time_s *= 1.0 + 0.1 * (1e3 * said.depth_m).sin();
            })
        },
        asked: Questions(60),
        says: "failed | report-differs, likely: the last event listed is not the end reported: a time of 0.00269358732120313 in the list, 0.002500072033469616 beside it",
    },
    Told {
        what: "ends of stages are left out of the events",
        solver: || listing(|_, said| said.events.retain(is_end)),
        asked: Questions(12),
        says: "failed | event-list, likely: every end is right, and the events listed are not: lists events, and not the crater-end at x = 0.038040821 m",
    },
    Told {
        what: "times of the events are those of the stage",
        solver: || {
            listing(|_, said| {
                let mut before = 0.0;
                for Event { state, .. } in &mut said.events {
                    let now = state.time;
                    state.time -= before;
                    before = now;
                }
            })
        },
        asked: Questions(12),
        says: "failed | event-list, likely: every end is right, and the events listed are not: the events listed are not of the stages, each once, in the order of time",
    },
    Told { what: "nothing, with events", solver: || listing(|_, _| ()), asked: AtEdges(60), says: "passed | " },
    Told {
        what: "a flight is cut short in the middle",
        solver: || {
            Answering::plain(|request| {
                let problem = request.problem(None);
                let flight = exact(&problem)?;
                let part = 0.3 + 0.2 * (1e3 * flight.end.depth).sin();
                let end = State {
                    time: part * flight.end.time,
                    depth: part * flight.end.depth,
                    velocity: 0.5 * problem.impact_speed,
                };
                Some(answer(Outcome::Stopped, end))
            })
        },
        asked: Questions(12),
        says: "failed | flight-cut-short, likely: the flight is said to stop, with V > 0 and no exit reached",
    },
    Told {
        what: "digits cancel where viscosity is weak beside a static force",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    let ratio = viscous_share(problem);
                    if ratio > 0.0 && ratio < 0.01 {
                        let lost = f64::EPSILON / ratio / ratio;
                        end.time *= 1.0 + lost;
                        if end.velocity > 0.0 {
                            end.velocity *= 1.0 + lost;
                        } else {
                            end.depth *= 1.0 + lost;
                        }
                    }
                },
            )
        },
        asked: Questions(200),
        says: "failed | digits-lost, likely: answers fail where a term is next to nothing beside another, and are the same at every tolerance: it is dropped, or digits cancel in a formula",
    },
    Told {
        what: "the depth of rest has two terms of a series where viscosity is small beside a static force",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    let ratio = viscous_share(problem);
                    if end.velocity == 0.0 && ratio > 0.0 && ratio <= 0.1 {
                        end.depth *= 1.0 - 0.5 * ratio * ratio;
                    }
                },
            )
        },
        asked: Questions(200),
        says: "failed | unknown, possible: no cause that is known explains the failing answers; the smallest that fails is weak-term-2 (static-force, viscosity, rest); `viscosity` stands in 100 % of the failing and 42 % of the passing questions",
    },
    Told {
        what: "a rest near the exit is called a perforation",
        solver: || {
            central(|_, problem, flight| {
                if flight.end.depth > 0.9 * problem.exit_depth {
                    flight.outcome = Outcome::Perforated;
                }
            })
        },
        asked: Questions(40),
        says: "failed | outcome-name, certain: the numbers are right, and the outcome named is not",
    },
    Told {
        what: "more softening, which few flights have, and rest at the exit that is called a way through",
        solver: || {
            Answering::plain(|request| {
                let mut problem = request.problem(None);
                problem.stages.iter_mut().filter(|law| law.stiffness < 0.0).for_each(|law| law.stiffness *= 1.25);
                let mut flight = exact(&problem)?;
                if flight.outcome != Outcome::Perforated && problem.has_exit() {
                    flight.outcome = Outcome::Perforated;
                }
                Some(answer(flight.outcome, flight.end))
            })
        },
        asked: Questions(40),
        says: "failed | term:stiffness, likely, 1.250000: the flight through a stage, from the solver's state at its start, is that with 1.250000 times the stiffness s: 5 of 5 wrong passages",
    },
    Told {
        what: "steps are of order one, and the depth at rest under a constant force is too small",
        solver: || {
            by_request(
                |_, _| (),
                |request, problem, end| {
                    let error = 0.3 * request.rtol.powf(0.125);
                    if end.velocity > 0.0 {
                        end.time *= 1.0 + error;
                    } else {
                        end.depth *= 1.0 - error;
                        end.time *= if is_steady(problem) { 1.0 } else { 1.0 - error };
                    }
                },
            )
        },
        asked: Questions(40),
        says: "failed | tolerance-missed, likely: errors of 5e-2, 2e-2 and 9e-3, at tolerances of 1e-6, 1e-9 and 1e-12: they fall as the tolerance to the power of 0.1, as with a wrong coefficient of the scheme, or events that are located less accurately than steps are taken",
    },
    Told { what: "nothing, by a series", solver: || RIGHT_SERIES.solver(), asked: Measured, says: "" },
    Told {
        what: "a series of V² without its last term",
        solver: || {
            Series { product: |v| (0..v.len().max(2) - 1).map(|i| v[i] * v[v.len() - 1 - i]).sum(), ..RIGHT_SERIES }
                .solver()
        },
        asked: Measured,
        says: "scheme-coefficient, likely, 0.500000: the first step under drag alone, V' = z V²/(V0 h), gives V the term 0.500000 z^2, where order 2 has 1 z^2, and under V' = z V/h it is right: as of a series of V² without its first or last term",
    },
    Told {
        what: "a series of V² without its terms in the middle",
        solver: || {
            let product = |v: &[f64]| if v.len() == 1 { v[0] * v[0] } else { 2.0 * v[0] * v[v.len() - 1] };
            Series { product, ..RIGHT_SERIES }.solver()
        },
        asked: Measured,
        says: "scheme-coefficient, likely, 0.666667: the first step under drag alone, V' = z V²/(V0 h), gives V the term 0.666667 z^3, where order 3 has 1 z^3, and under V' = z V/h it is right: as of a series of V² without its terms in the middle",
    },
    Told {
        what: "a series whose terms of V² are added to those of the step before",
        solver: || Series { adds_up: true, ..RIGHT_SERIES }.solver(),
        asked: Questions(60),
        says: "failed | step-kept, likely: flights that fail are right in parts: errors of 2e-1 as a whole, 5e-16 in 8 and 3e-15 in 64 parts. Twice as many parts leave nothing of the error where each becomes a single step: what is wrong begins with the second step of a stage, which finds something that the first one left",
    },
    Told {
        what: "steps of one length at every tolerance",
        solver: || Stepping { steps: |_, _| 12.0, ..RIGHT }.solver(),
        asked: Questions(60),
        says: "failed | steps-too-long, likely: flights that fail are right in parts: errors of 1e0 as a whole, 1e-9 in 8 and 3e-13 in 64 parts. The force is right, and steps are too long, and the same at every tolerance: that is ignored, or the estimate of their error is wrong",
    },
    Told {
        what: "every number is printed with six decimals",
        solver: || {
            altered(
                |_| (),
                |_, state| {
                    let cut = |number: f64| (number * 1e6).round() / 1e6;
                    *state = State { time: cut(state.time), depth: cut(state.depth), velocity: cut(state.velocity) };
                },
            )
        },
        asked: Questions(40),
        says: "failed | few-digits, certain: every number is printed with at most 6 decimals: print 17 digits",
    },
    Told {
        what: "the third term of V in a series is a fifth too great",
        solver: || Series { factor: |power| if power == 3 { 1.2 } else { 1.0 }, ..RIGHT_SERIES }.solver(),
        asked: Measured,
        says: "scheme-coefficient, likely, 1.200000: the first step under V' = z V/h gives V the term 0.200000 z^3, where order 3 has 0.166667 z^3",
    },
    Told {
        what: "the weights of two slopes are exchanged",
        solver: || with_weights([1.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 6.0]).solver(),
        asked: Measured,
        says: "scheme-coefficient, likely, 0.833333: the first step under a constant deceleration a has a h² in x with a factor 0.416667, not 0.5",
    },
    Told {
        what: "the exit is placed on a cubic, with another slope at the end of the step",
        solver: || Stepping { exit: Placed::OnCubic([1.0, 0.7]), steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "event-interpolated, likely: the velocity at an exit is right at the ends of steps and off by up to 3e-3 between them at a tolerance of 1e-6, most in the second half of the step, as with a wrong slope at its end: events are interpolated, less accurately than steps are taken",
    },
    Told {
        what: "the exit is placed on a cubic, with another slope at the start of the step",
        solver: || Stepping { exit: Placed::OnCubic([0.7, 1.0]), steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "event-interpolated, likely: the velocity at an exit is right at the ends of steps and off by up to 3e-3 between them at a tolerance of 1e-6, most in the first half of the step, as with a wrong slope at its start: events are interpolated, less accurately than steps are taken",
    },
    Told {
        what: "no step is below ten microseconds, whatever the tolerance",
        solver: || Stepping { steps: |rtol, _| rtol.powf(-0.25), step: |step| step.max(1e-5), ..RIGHT }.solver(),
        asked: Measured,
        says: "least-step, likely: flights of 1e-4 s and less have one answer at every tolerance, and longer ones are right: there is a least step, which the tolerance does not undercut",
    },
    Told {
        what: "no tolerance is below 1e-7",
        solver: || Stepping { steps: |rtol, _| 0.1 * rtol.max(1e-7).powf(-0.25), ..RIGHT }.solver(),
        asked: Measured,
        says: "tolerance-ignored, likely: answers at tolerances of 1e-7 and less are one, with an error of 3e-7, and looser ones differ: no tolerance below about 1e-7 is taken",
    },
    Told {
        what: "an iteration stops at a hundredth of a m/s, which slow flights alone show",
        solver: || altered(|_| (), |problem, end| end.time *= 1.0 + 5e-10 / problem.impact_speed.powi(2)),
        asked: AtEdges(12),
        says: "failed | absolute-tolerance, likely: at one relative tolerance the error falls from 5e-8 to 2e-16 as the same flight grows 32768 times in length and speed: the tolerance, or that of an iteration, is an absolute one, whatever is asked for",
    },
    Told {
        what: "of several ends of stages in one step some are not listed",
        solver: || {
            listing_in_steps(VelocityAt::LaggedHalfStep, Boundaries::StepEnd, |problem, events| {
                // Of thin stages, which no step of its ladder meets.
                let is_thin = |stage: usize| {
                    let start = problem.start_of(stage);
                    problem.stages[stage].end - start < 2e-3 * start
                };
                events.retain(|event| !matches!(event.kind, EventKind::StageEnd(stage) if is_thin(stage)));
            })
        },
        asked: Questions(60),
        says: "failed | event-list, certain: every end is right, and the events listed are not: lists events, and not the stage-end at x = 0.051662235 m, where ends of several stages lie in one step",
    },
    Told {
        what: "nothing, in fixed steps that list several ends of stages in one step",
        solver: || listing_in_steps(VelocityAt::LaggedHalfStep, Boundaries::StepEnd, |_, _| ()),
        asked: Questions(60),
        says: "passed | drag-lagged, certain: the force is evaluated with V half a step behind: order 1 wherever it depends on V",
    },
    Told {
        what: "jumps of the force are spread over a hundredth of their depth",
        solver: || {
            of_force(|place, _| {
                let force = |stage: &Stage| stage.force(place.depth, place.velocity);
                let jumps = place.problem.stages.windows(2).map(|pair| {
                    let part = ((place.depth - pair[0].end) / (0.01 * pair[0].end)).clamp(0.0, 1.0);
                    if part > 0.0 { part * (force(&pair[1]) - force(&pair[0])) } else { 0.0 }
                });
                force(&place.problem.stages[0]) + jumps.sum::<f64>()
            })
        },
        asked: Questions(60),
        says: "failed | force-smoothed, certain: the jump of the force at each end of a stage is spread behind it, over 0.0100000 times the depth of that end",
    },
    Told {
        what: "one answer to every question",
        solver: || {
            Answering::plain(|_| Some(answer(Outcome::Stopped, State { time: 0.001, depth: 0.1, velocity: 0.0 })))
        },
        asked: Questions(60),
        says: "failed | same-answer, certain: every question has the same answer: x = 0.1 m, t = 0.001 s, V = 0 m/s",
    },
    Told {
        what: "a stage of drag is left at the mean of two speeds",
        solver: || {
            by_stages(|&Staged { alone, .. }, end| {
                if alone.stages[0].drag > 0.0 && end.velocity > 0.0 {
                    end.time = 2.0 * end.depth / (alone.impact_speed + end.velocity);
                }
            })
        },
        asked: Questions(200),
        says: "failed | stage-wrong, likely: the flight through a stage, from the solver's state at its start, has a wrong time alone where it has drag and the flight leaves it: 90 of 91 such passages, and none of the 228 others",
    },
    Told {
        what: "the depth of a stage of drag by the logarithm to ten",
        solver: || {
            by_stages(|&Staged { alone, .. }, end| {
                if alone.stages[0].drag > 0.0 && end.velocity == 0.0 {
                    end.depth /= std::f64::consts::LN_10;
                }
            })
        },
        asked: Questions(200),
        says: "failed | stage-wrong, likely, 0.434294: the flight through a stage, from the solver's state at its start, has a wrong depth alone, 0.434294 times the right one, where it has drag and the flight comes to rest in it: 47 of 47 such passages, and none of the 273 others",
    },
    Told {
        what: "times and speeds are off by a part that is another at each tolerance and impact speed, and one at exits close to each other",
        solver: || {
            by_request(
                |_, _| (),
                |request, problem, end| {
                    let part = (0.37 * request.rtol.log10() + 0.618 * problem.impact_speed).rem_euclid(1.0);
                    end.time *= 1.0 + 4e-7 * (part - 0.4);
                    end.velocity *= 1.0 + 4e-7 * (0.6 - part);
                },
            )
        },
        asked: Questions(60),
        says: "failed | tolerance-ignored, likely: errors of 8e-8, 1e-7 and 1e-7, at tolerances of 1e-6, 1e-9 and 1e-12: they stop falling far above the round-off of 64-bit numbers, and are nearly one at exits close to each other, so that they are those of steps: no tolerance below some bound is taken",
    },
    Told {
        what: "an answer to flights of more than 3 km/s alone",
        solver: || {
            Answering::plain(|request| {
                let problem = request.problem(None);
                let flight = exact(&problem).filter(|_| problem.impact_speed > 3e3)?;
                Some(answer(flight.outcome, State { time: 0.001, depth: 0.1, velocity: 0.0 }))
            })
        },
        asked: Questions(60),
        says: "failed | no-answer, likely: 57 questions have no answer: reports an error: it never ends",
    },
    Told {
        what: "a depth that is another one in every answer, and four digits of every number",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    let cut = |number: f64| format!("{number:.3e}").parse().unwrap_or(number);
                    end.depth *= 1.0 + 0.2 * (1e3 * problem.impact_speed).sin();
                    *end = State { time: cut(end.time), depth: cut(end.depth), velocity: cut(end.velocity) };
                },
            )
        },
        asked: Questions(60),
        says: "failed | unknown, possible: no cause that is known explains the failing answers; the smallest that fails is static-force-1 (static-force, exit)",
    },
    Told {
        what: "times are wrong in the stage behind one with viscosity",
        solver: || {
            by_stages(|&Staged { problem, index, .. }, end| {
                if index > 0 && problem.stages[index - 1].viscosity > 0.0 {
                    end.time *= 1.01;
                }
            })
        },
        asked: Questions(200),
        says: "failed | stage-wrong, likely, 1.010000: the flight through a stage, from the solver's state at its start, has a wrong time alone, 1.010000 times the right one, where the stage before has viscosity: 58 of 58 such passages, and none of the 262 others",
    },
    Told {
        what: "times are wrong in the crater where the criterion is ndrc",
        solver: || {
            by_stages(|&Staged { request, index, .. }, end| {
                if index == 0 && request.scene.as_ref().is_some_and(|scene| scene.criterion == "ndrc") {
                    end.time *= 1.01;
                }
            })
            .of_scenes()
        },
        asked: Questions(200),
        says: "failed | stage-wrong, likely, 1.010000: the flight through a stage, from the solver's state at its start, has a wrong time alone, 1.010000 times the right one, where it is without a static force and the criterion is `ndrc`: 30 of 30 such passages, and none of the 213 others",
    },
    Told {
        what: "times are wrong in some of the stages with drag",
        solver: || {
            by_stages(|&Staged { alone, .. }, end| {
                if alone.stages[0].drag > 0.0 && (1e3 * alone.impact_speed).sin() > 0.0 {
                    end.time *= 1.01;
                }
            })
        },
        asked: Questions(200),
        says: "failed | stage-wrong, possible, 1.010000: the flight through a stage, from the solver's state at its start, has a wrong time alone, 1.010000 times the right one, in part of those where it has drag: 70 of 139 such passages, and none of the 181 others",
    },
    Told {
        what: "each whole step counts as a tenth more than it lasts",
        solver: || {
            by_request(
                |_, _| (),
                |request, problem, end| {
                    let step = request.atol[0] / (request.rtol * problem.impact_speed) / 23.0;
                    end.time += 0.1 * step * (end.time / step).floor();
                },
            )
        },
        asked: Questions(60),
        says: "failed | clock, likely: the time alone is wrong, by what stays the same from exit to exit within a step: the clock goes on by another length than that of the step",
    },
    Told {
        what: "V at the exit is a thousandth too small above a mass that few questions have",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    if problem.mass > 200.0 {
                        end.velocity *= 0.999;
                    }
                },
            )
        },
        asked: AtEdges(200),
        says: "failed | stage-wrong, likely, 0.999000: the flight through a stage, from the solver's state at its start, has a wrong velocity alone, 0.999000 times the right one, where the mass is above a number from 4.582e2 to 5.617e2 kg: 8 of 10 such passages, and none of the 574 others",
    },
    Told {
        what: "all rates lack nearly one part of them, at every tolerance",
        solver: || {
            altered(
                |_| (),
                |problem, end| {
                    end.time *= 1.0 + 2e-5 + 1e-6 * (1e3 * problem.impact_speed).sin();
                    end.depth *= 1.0 + if end.velocity > 0.0 { 0.0 } else { 2e-6 * (1e3 * problem.impact_speed).cos() };
                },
            )
        },
        asked: Questions(60),
        says: "failed | weights, likely, 0.999980: the time is off by nearly one part of it, +2.0e-5, and the path by less: x and V change by 0.9999798 of their rates, as where the weights of the scheme add up to that",
    },
    Told {
        what: "exits are taken a little before or behind them, by less at tighter tolerances",
        solver: || {
            by_request(
                |_, _| (),
                |request, problem, end| {
                    if end.velocity > 0.0 {
                        let late = 0.1 * request.rtol.powf(0.3) * (1e3 * problem.impact_speed).sin() * end.time;
                        let law =
                            problem.stages[problem.stages.iter().position(|law| end.depth <= law.end).unwrap_or(0)];
                        end.velocity -= late * law.force(end.depth, end.velocity) / problem.mass;
                        end.time += late;
                    }
                },
            )
        },
        asked: Questions(60),
        says: "failed | event-loose, likely: time and velocity at an exit are those of a moment a little before or behind it: the end is not located as accurately as steps are taken",
    },
    Told {
        what: "the clock starts anew in each stage, in fixed steps",
        solver: || {
            by_stages(|&Staged { request, alone, .. }, end| {
                let step = request.dt_s.unwrap_or(0.0) * alone.impact_speed / end.depth;
                end.time *= 1.0 + 0.1 * step * step;
            })
            .reporting(|answer| {
                let entered = answer.events.last().map_or(0.0, |event| event.state.time);
                answer.time_s -= entered;
                let times: Vec<f64> = answer.events.iter().map(|event| event.state.time).collect();
                for (event, before) in answer.events.iter_mut().skip(1).zip(times) {
                    event.state.time -= before;
                }
            })
            .in_fixed_steps()
        },
        asked: Questions(60),
        says: "failed | time-restarts, certain: time starts anew at the end of each stage",
    },
    Told {
        what: "x is advanced by the mean of V, and V by the classical scheme",
        solver: || Stepping { by_mean_speed: true, ..FIXED }.solver().claiming(4.0),
        asked: Questions(120),
        says: "failed | order, likely: the order of the depth alone falls to 2, where the force does not depend on x and the time keeps its order: x is advanced by a rule of a lower order than V",
    },
    Told {
        what: "behind the end of a stage the clock goes on from the end of the step",
        solver: || Stepping { clock: |part, whole, is_end| if is_end { part } else { whole }, ..FIXED }.solver(),
        asked: Questions(120),
        says: "passed | clock, likely: the time alone has order 1, and only behind the end of a stage: the clock goes on from the end of the step that passes it, not from the end of the stage",
    },
    Told {
        what: "ends are placed on the chord of a fixed step",
        solver: || {
            let (exit, rest, stage_end) = (Placed::OnChord, Placed::OnChord, Placed::OnChord);
            Stepping { exit, rest, stage_end, ..FIXED }.solver().claiming(4.0)
        },
        asked: Questions(60),
        says: "failed | event-interpolated, likely: the time at an exit is right at the ends of steps and off by up to 3e-2 between them at steps of 1.7e-3 s: events are interpolated, less accurately than steps are taken",
    },
    Told {
        what: "the step that lands on the exit is one of the midpoint rule",
        solver: || Stepping { exit: Placed::ByMidpoint, steps: |_, _| 7.0, ..RIGHT }.solver(),
        asked: Measured,
        says: "event-interpolated, likely: the time at an exit is right at the ends of steps and off by up to 2e-3 between them at a tolerance of 1e-6, most of all in front of those: the step that is shortened to land on an end is of a lower order than the others, or the interpolant of a step does not end where the step does",
    },
];
