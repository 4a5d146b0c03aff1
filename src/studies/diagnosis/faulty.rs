//! Solvers that are wrong on purpose: does a diagnosis say of each what is wrong with it?

mod linearised;
mod series;
mod several;
mod stepping;
mod told;

use rayon::prelude::*;

pub(crate) use self::told::mistold;
#[cfg(test)]
pub(super) use self::told::{Answering, Staged, altered, by_stages, exact};
#[cfg(test)]
use super::hypotheses::slips_of_scenes;
use super::hypotheses::{Fault, How, Hypothesis, Parameter, hypotheses, predict};
use super::questions::{Question, questions};
use super::{Cause, Certainty, Diagnosis, Plan, Solver, Verdict, by_questions, diagnose};
use crate::exchange::peers::{PeerAnswer, PeerFailure, PeerIdentity, PeerRequest};
use crate::integrators::{Boundaries, CentralDifference, Detail, Integrator, VelocityAt};
use crate::physics::{Outcome, State};

/// A solver with faults, exact but for them.
pub(super) struct Faulty<'a> {
    faults: Vec<Fault<'static>>,
    questions: &'a [Question],
    reads_scene: bool,
}

impl<'a> Faulty<'a> {
    pub(super) fn new(faults: Vec<Fault<'static>>, questions: &'a [Question]) -> Self {
        let reads_scene = faults.iter().any(|(fault, _)| fault.needs_scene());
        Self { faults, questions, reads_scene }
    }

    /// What is found of it by its questions.
    pub(super) fn diagnosed(mut self) -> Diagnosis {
        let questions = self.questions;
        by_questions(&mut self, questions, &|_, _| {})
    }
}

pub(super) fn failure(why: &str) -> PeerFailure {
    let fault = crate::exchange::peers::PeerFault::Reported(why.to_owned());
    PeerFailure { peer: "faulty".to_owned(), fault, stderr: String::new() }
}

pub(super) fn answer(outcome: Outcome, State { time, depth, velocity }: State) -> PeerAnswer {
    PeerAnswer {
        outcome,
        depth_m: depth,
        time_s: time,
        velocity_m_s: velocity,
        events: Vec::new(),
        force_evaluations: None,
        wall_ns: None,
        wall_ns_quartiles: None,
    }
}

impl Solver for Faulty<'_> {
    fn identity(&self) -> PeerIdentity {
        PeerIdentity { name: "faulty".to_owned(), reads_scene: self.reads_scene, ..PeerIdentity::default() }
    }

    fn command(&self) -> String {
        "faulty".to_owned()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        let is_asked = |question: &&Question| {
            let PeerRequest { velocity_m_s, stages, mass_kg, .. } = request;
            let problem = &question.problem;
            problem.impact_speed == *velocity_m_s
                && problem.mass == *mass_kg
                && problem.stages[..] == stages[..]
                && problem.exit_depth == request.exit_depth_m.unwrap_or(f64::INFINITY)
        };
        let question = self.questions.iter().find(is_asked).ok_or_else(|| failure("another question"))?;
        if question.problem.impact_speed == 0.0 {
            return Ok(answer(question.exact.outcome, question.exact.end));
        }
        let faults: Vec<Fault<'_>> = self
            .faults
            .iter()
            .map(|(fault, number)| (*fault, fault.parameter.own_example(question).unwrap_or(*number)))
            .collect();
        let (problem, found) = predict(question, &faults, How::Exact).ok_or_else(|| failure("it never ends"))?;
        let is_through = found.end.depth >= question.problem.exit_depth * (1.0 - 1e-12) && problem.has_exit();
        let outcome = if is_through { Outcome::Perforated } else { Outcome::Stopped };
        Ok(answer(outcome, found.end))
    }

    fn restart(&mut self) -> bool {
        true
    }
}

/// Central difference at the step that is asked for.
pub(super) struct Paper(pub(super) CentralDifference, pub(super) f64);

impl Solver for Paper {
    fn identity(&self) -> PeerIdentity {
        PeerIdentity { name: "paper".to_owned(), fixed_step: true, ..PeerIdentity::default() }
    }

    fn command(&self) -> String {
        "paper".to_owned()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        let mut problem = request.problem(None);
        problem.stages.iter_mut().for_each(|law| law.drag *= self.1);
        let step = request.dt_s.ok_or_else(|| failure("no step"))?;
        let scheme = CentralDifference::uniform(step, self.0.velocity, self.0.boundaries);
        let flight = scheme.solve(&problem, Detail::End).map_err(|error| failure(&error.to_string()))?;
        Ok(answer(flight.outcome, flight.end))
    }

    fn restart(&mut self) -> bool {
        true
    }
}

/// How many known causes are tried, each `each`-th of them, and those that are not named, with their number, to a solver that has
/// this one fault and is asked `count` questions.
pub(crate) fn misnamed(seed: u64, count: usize, each: usize) -> (usize, Vec<String>) {
    let is_tried = |hypothesis: &&Hypothesis| {
        hypothesis.id != "outcome-name" && !matches!(hypothesis.parameter, Parameter::Choice(_))
    };
    misnamed_of(&hypotheses().filter(is_tried).step_by(each.max(1)).collect::<Vec<_>>(), seed, count)
}

/// The same of slips in the formulas of a scene that flights show.
#[cfg(test)]
pub(super) fn misnamed_slips(seed: u64, count: usize) -> (usize, Vec<String>) {
    let questions = questions(seed, count, true);
    let is_seen = |slip: &&Hypothesis| {
        let moves = |question: &&Question| {
            let found = predict(question, &[(slip, 1.0)], How::Exact);
            found.is_some_and(|(_, found)| (found.end.depth / question.exact.end.depth - 1.0).abs() > 1e-3)
        };
        questions.iter().filter(moves).count() > 10
    };
    misnamed_of(&slips_of_scenes().iter().filter(is_seen).collect::<Vec<_>>(), seed, count)
}

fn misnamed_of(all: &[&'static Hypothesis], seed: u64, count: usize) -> (usize, Vec<String>) {
    // Shared: what a fault makes of a question is computed once, and not for each solver.
    let of_stages_and_of_scenes = [false, true].map(|of_scenes| questions(seed, count, of_scenes));
    let missed = all.par_iter().filter_map(|hypothesis| {
        let number = hypothesis.parameter.example();
        let questions = &of_stages_and_of_scenes[usize::from(hypothesis.needs_scene())];
        let found = Faulty::new(vec![(hypothesis, number)], questions).diagnosed();
        let first = found.causes.first();
        let is_named = first.is_some_and(|cause| {
            let is_near = |factor: f64| (factor / number - 1.0).abs() < 0.01;
            cause.id == hypothesis.id && cause.factor.is_none_or(is_near)
        });
        (!is_named).then(|| format!("{}: {}: {first:?}", hypothesis.id, hypothesis.statement))
    });
    (all.len(), missed.collect())
}

/// How many schemes of fixed steps are tried, and those that are not told what they are: sound, by their rules and what lowers
/// their order, and with twice the drag.
pub(crate) fn misnamed_schemes(seed: u64, count: usize) -> (usize, Vec<String>) {
    let rules = VelocityAt::ALL.into_iter().flat_map(|rule| Boundaries::ALL.map(|boundaries| (rule, boundaries)));
    let sound = rules.clone().map(|(velocity, boundaries)| (velocity, boundaries, 1.0));
    let is_lagged = |(velocity, _): &(VelocityAt, Boundaries)| *velocity == VelocityAt::LaggedHalfStep;
    let wrong = rules.filter(is_lagged).map(|(velocity, boundaries)| (velocity, boundaries, 2.0));
    let all: Vec<_> = sound.chain(wrong).collect();
    let missed = all.par_iter().filter_map(|&(velocity, boundaries, factor)| {
        let scheme = CentralDifference::uniform(1.0, velocity, boundaries);
        let found =
            diagnose(&mut Paper(scheme, factor), Plan { seed, questions: count, asks_edges: false }, &|_, _| {});
        let has = |id: &str| found.causes.iter().any(|cause| cause.id == id);
        let is_told = if factor == 1.0 {
            found.verdict == Verdict::Passed
                && found.scheme.as_ref().is_some_and(|scheme| {
                    (scheme.velocity, scheme.events) == (Some(velocity.name()), Some(boundaries.name()))
                })
                && has("drag-lagged") == (velocity == VelocityAt::LaggedHalfStep)
                && has("exit-late") == (boundaries == Boundaries::StepEnd)
        } else {
            let first = found.causes.first().filter(|cause| cause.certainty == Certainty::Certain);
            let is_near = |cause: &Cause| cause.factor.is_some_and(|found| (found / factor - 1.0).abs() < 1e-6);
            found.verdict == Verdict::Failed && first.is_some_and(|cause| cause.id == "term:drag" && is_near(cause))
        };
        let ids: Vec<&str> = found.causes.iter().map(|cause| cause.id.as_str()).collect();
        (!is_told)
            .then(|| format!("{velocity} {boundaries}, {factor} times the drag: {} {ids:?}", found.verdict.name()))
    });
    (all.len(), missed.collect())
}
