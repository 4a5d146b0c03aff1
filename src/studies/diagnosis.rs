//! Is a solver right, and if not, what is wrong with it?
//!
//! The solver is asked generated questions whose answers are known (`questions`). An adaptive one is asked at three
//! tolerances and may err by [`ALLOWED`] times the tolerance and the condition of the problem (`tolerances`); one of fixed
//! steps is asked on a ladder of steps, and its limit judged (`fixed_steps`, `ladder`), and its list of events where several lie in
//! one step (`crowded`). Where answers fail, each cause that is known
//! computes what it would have answered (`hypotheses`, `simulation`), and the one that explains them is named
//! (`causes`). Where none is certain, questions of another kind measure what the solver does (`measurements`).

mod causes;
mod crowded;
#[cfg(any(test, feature = "report"))]
mod faulty;
mod fixed_steps;
mod hypotheses;
mod ladder;
mod measurements;
mod numbers;
mod observations;
mod questions;
mod simulation;
mod slips;
mod tolerances;

use serde::Serialize;
use strum::IntoEnumIterator;

pub use self::causes::{Cause, Certainty};
#[cfg(feature = "report")]
pub(crate) use self::faulty::{misnamed, misnamed_schemes, mistold};
use self::fixed_steps::in_fixed_steps;
#[cfg(feature = "report")]
pub(crate) use self::hypotheses::changed_by_nothing;
#[cfg(feature = "report")]
pub use self::hypotheses::{Effect, KnownCause, known_causes};
#[cfg(feature = "report")]
pub(crate) use self::ladder::{LADDER, Limit};
use self::measurements::{add_measured, add_weights};
pub use self::questions::{Content, contents};
use self::questions::{Question, edge_questions, in_order, questions, slow_questions};
use self::tolerances::{at_tolerances, row};
use super::verdict::Verdict;
use crate::exchange::peers::{Peer, PeerAnswer, PeerFailure, PeerFault, PeerIdentity, PeerRequest};
use crate::physics::{Criterion, Outcome, Scene, State};

/// Relative tolerances at which an adaptive solver is asked.
pub const TOLERANCES: [f64; 3] = [1e-6, 1e-9, 1e-12];
/// Error allowed over the tolerance and the condition number. The worst of sound solvers measured: 135 (BDF).
pub const ALLOWED: f64 = 1e3;
/// Ids of causes that say how large errors are, and not what is wrong.
const SYMPTOMS: [&str; 3] = ["tolerance-missed", "tolerance-ignored", "single-precision"];
/// Times that a solver is started again after it died; one that fell silent is so many times as costly.
const RESTARTS_MAX: usize = 30;
const RESTARTS_OF_SILENCE: usize = 30;

/// Names of the quantities of an answer.
pub const QUANTITIES: [&str; 3] = ["depth", "time", "velocity"];

/// What is diagnosed: a program, or a solver within this one.
pub trait Solver {
    /// Who it says it is.
    fn identity(&self) -> PeerIdentity;

    /// The command that starts it.
    fn command(&self) -> String;

    /// Its answer to `request`.
    ///
    /// # Errors
    /// [`PeerFailure`].
    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure>;

    /// Starts it again after a failure; whether it can be asked.
    fn restart(&mut self) -> bool;
}

impl Solver for Peer {
    fn identity(&self) -> PeerIdentity {
        Self::identity(self).clone()
    }

    fn command(&self) -> String {
        Self::command(self).to_owned()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        self.ask_any_events(request)
    }

    fn restart(&mut self) -> bool {
        let Ok(again) = Self::start(Self::command(self)) else { return false };
        *self = again;
        true
    }
}

/// How a solver is asked.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Seed of the questions.
    pub seed: u64,
    /// How many.
    pub questions: usize,
    /// Whether the events at their edges, and slow flights, are asked too, of a solver that reads stages and takes a tolerance.
    pub asks_edges: bool,
}

impl Default for Plan {
    fn default() -> Self {
        Self { seed: 1, questions: 200, asks_edges: true }
    }
}

/// Who was diagnosed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Subject {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Its method.
    pub method: String,
    /// The command that started it.
    pub command: String,
    /// Whether it takes fixed steps.
    pub fixed_step: bool,
    /// What it reads: `stages` or `scene`.
    pub reads: &'static str,
}

/// Numbers of questions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Counts {
    /// Asked.
    pub asked: usize,
    /// Answered within the limit.
    pub passed: usize,
    /// Not.
    pub failed: usize,
    /// Neither can be said.
    pub undecided: usize,
    /// Not asked: the solver was not there any more, or the cause was certain before.
    pub skipped: usize,
}

/// Depth, time and velocity, or what is said of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Each {
    /// Of the depth.
    pub depth: f64,
    /// Of the time.
    pub time: f64,
    /// Of the velocity, over V0.
    pub velocity: f64,
}

impl Each {
    fn of([depth, time, velocity]: [f64; 3]) -> Self {
        Self { depth, time, velocity }
    }
}

/// The end of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct End {
    /// How it ends.
    pub outcome: Outcome,
    /// Time, depth, velocity.
    #[serde(flatten)]
    pub state: State,
}

/// A question and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Asked {
    /// Its name.
    pub id: String,
    /// What its flight meets.
    pub contains: Vec<Content>,
    /// How its answer fares.
    pub verdict: Verdict,
    /// Relative tolerance of the answer shown; `null` for fixed steps.
    pub rtol: Option<f64>,
    /// Step (s) of the answer shown; `null` for adaptive solvers.
    pub dt_s: Option<f64>,
    /// The right answer.
    pub expected: End,
    /// The answer; `null` if none came.
    pub answered: Option<End>,
    /// Relative error of the answer, or of its limit for fixed steps, with its sign; of the velocity over V0.
    pub relative_error: Option<Each>,
    /// What is allowed of it.
    pub limit: Option<Each>,
    /// What is wrong, in words; empty if nothing is.
    pub reason: String,
}

/// The scheme of fixed steps that reproduces every answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Reproduced {
    /// `central-difference`, `euler`, `semi-implicit-euler`, `heun`, `midpoint` or `runge-kutta-4`.
    pub name: &'static str,
    /// Velocity rule of central difference.
    pub velocity: Option<&'static str>,
    /// Treatment of events.
    pub events: Option<&'static str>,
    /// Largest relative difference from an answer.
    pub largest_difference: f64,
}

/// The order of a quantity over all questions.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct QuantityOrder {
    /// `depth`, `time` or `velocity`.
    pub quantity: &'static str,
    /// Order claimed; `null` if none is.
    pub formal_order: Option<f64>,
    /// Order found; `null` if the errors have none.
    pub observed_order: Option<f64>,
    /// Its 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// What the errors do.
    pub class: super::order::Class,
    /// Whether an order was claimed, and how that fares.
    pub verdict: Verdict,
}

/// What a diagnosis comes to.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Diagnosis {
    /// Sound, wrong, or undecided.
    pub verdict: Verdict,
    /// Who.
    pub peer: Subject,
    /// How many questions.
    pub counts: Counts,
    /// What is wrong, best first; of a sound solver what lowers its order.
    pub causes: Vec<Cause>,
    /// The scheme that reproduces the answers, of fixed steps.
    pub scheme: Option<Reproduced>,
    /// The orders, of fixed steps.
    pub orders: Vec<QuantityOrder>,
    /// What the failing questions have in common, where no cause explains them.
    pub separation: Option<String>,
    /// The questions.
    pub questions: Vec<Asked>,
}

/// Answers to one question.
#[derive(Clone)]
struct Answered<'a> {
    question: &'a Question,
    /// Setting (tolerance or step) and answer, or why there is none.
    answers: Vec<(f64, Result<PeerAnswer, String>)>,
}

/// Diagnoses `solver`; `progress` is called after each question with the number of questions asked and to be asked.
pub fn diagnose(solver: &mut dyn Solver, plan: Plan, progress: &dyn Fn(usize, usize)) -> Diagnosis {
    let all = questions_to(&solver.identity(), plan);
    by_questions(solver, &all, progress)
}

/// The questions of `plan` that a solver of this `identity` is asked, in their order.
fn questions_to(identity: &PeerIdentity, plan: Plan) -> Vec<Question> {
    let mut all = questions(plan.seed, plan.questions, identity.reads_scene);
    if plan.asks_edges && !identity.fixed_step && !identity.reads_scene {
        all.extend(edge_questions());
        all.extend(slow_questions(plan.seed));
    }
    in_order(&mut all);
    all
}

/// Diagnoses `solver` by `all` questions.
fn by_questions(solver: &mut dyn Solver, all: &[Question], progress: &dyn Fn(usize, usize)) -> Diagnosis {
    let identity = solver.identity();
    let peer = Subject {
        name: identity.name.clone(),
        version: identity.version.clone(),
        method: identity.method.clone(),
        command: solver.command(),
        fixed_step: identity.fixed_step,
        reads: if identity.reads_scene { "scene" } else { "stages" },
    };
    let mut asking = Asking::new(solver);
    let mut found = if identity.fixed_step {
        in_fixed_steps(&mut asking, peer, &identity, all, progress)
    } else {
        at_tolerances(&mut asking, peer, &identity, all, progress)
    };
    let is_named = found.causes.iter().any(|cause| cause.certainty == Certainty::Certain);
    let is_of_low_order =
        found.causes.first().is_some_and(|cause| ["first-order-scheme", "stage-end-late"].contains(&cause.id.as_str()));
    if (found.verdict == Verdict::Failed || is_of_low_order) && !is_named {
        add_measured(&mut asking, all, &mut found);
    }
    add_weights(&mut asking, &mut found);
    found
}

/// Asks `solver`, which takes a tolerance, what lies at the edges, and `plan.questions` more; each is judged, and no
/// cause is looked for. `progress` as in [`diagnose`].
pub fn at_edges(solver: &mut dyn Solver, plan: Plan, progress: &dyn Fn(usize, usize)) -> Vec<Asked> {
    let mut all = edge_questions();
    all.extend(questions(plan.seed, plan.questions, false));
    let mut asking = Asking::new(solver);
    let mut asked = Vec::with_capacity(all.len());
    for question in &all {
        asked.push(row(&asking.at_tolerances(question)));
        progress(asked.len(), all.len());
    }
    asked
}

/// A solver that may have to be started again.
struct Asking<'a> {
    solver: &'a mut dyn Solver,
    reads_scene: bool,
    restarts: usize,
    is_gone: bool,
}

impl<'a> Asking<'a> {
    fn new(solver: &'a mut dyn Solver) -> Self {
        let reads_scene = solver.identity().reads_scene;
        Self { solver, reads_scene, restarts: 0, is_gone: false }
    }

    /// Whether it may say that it cannot answer: not every reader of scenes knows the criterion `ndrc`.
    fn may_decline(&self, question: &Question) -> bool {
        let is_ndrc = |scene: &Scene| scene.criterion == Criterion::Ndrc;
        self.reads_scene && question.scene.as_ref().is_some_and(is_ndrc)
    }

    /// Asks `question` at every tolerance.
    fn at_tolerances<'q>(&mut self, question: &'q Question) -> Answered<'q> {
        let mut answers = Vec::with_capacity(TOLERANCES.len());
        for rtol in TOLERANCES {
            let restarts = self.restarts;
            let answer = self.ask(&request(question, rtol));
            if answer.is_err() && self.restarts == restarts && self.may_decline(question) {
                break;
            }
            answers.push((rtol, answer));
            // What it died of once, it dies of again.
            if self.restarts > restarts {
                break;
            }
        }
        Answered { question, answers }
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, String> {
        if self.is_gone {
            return Err("the solver is gone".to_owned());
        }
        self.solver.ask(request).map_err(|failure| {
            if !failure.is_reported() {
                let is_silent = matches!(failure.fault, PeerFault::Silent(_));
                self.restarts += if is_silent { RESTARTS_OF_SILENCE } else { 1 };
                self.is_gone = self.restarts > RESTARTS_MAX || !self.solver.restart();
            }
            failure.fault.to_string()
        })
    }
}

/// The question about `question` at a tolerance.
fn request(question: &Question, rtol: f64) -> PeerRequest {
    PeerRequest { scene: question.peer_scene(), ..PeerRequest::from_problem(&question.problem, rtol) }
}

fn end_of(answer: &PeerAnswer) -> End {
    let state = State { time: answer.time_s, depth: answer.depth_m, velocity: answer.velocity_m_s };
    End { outcome: answer.outcome, state }
}

fn expected(question: &Question) -> End {
    End { outcome: question.exact.outcome, state: question.exact.end }
}

fn count(asked: &[Asked], wanted: usize) -> Counts {
    let of = |verdict| asked.iter().filter(|asked| asked.verdict == verdict).count();
    let skipped = of(Verdict::Skipped);
    Counts {
        asked: asked.len() - skipped,
        passed: of(Verdict::Passed),
        failed: of(Verdict::Failed),
        undecided: of(Verdict::Undecided),
        skipped: skipped + wanted - asked.len(),
    }
}

/// Adds `unknown` where nothing explains all, and what tells failing from passing questions.
fn finish(mut diagnosis: Diagnosis) -> Diagnosis {
    if diagnosis.verdict != Verdict::Failed {
        return diagnosis;
    }
    let explains_all = |cause: &Cause| cause.certainty != Certainty::Possible;
    if diagnosis.causes.iter().any(explains_all) {
        return diagnosis;
    }
    let separation = separation(&diagnosis.questions);
    let statement = format!("no cause that is known explains the failing answers; {separation}");
    let cause = Cause::plain("unknown", statement, Certainty::Possible, 0, diagnosis.counts.failed);
    diagnosis.separation = Some(separation);
    diagnosis.causes.insert(0, cause);
    diagnosis
}

/// The smallest question that fails, and what failing questions hold that passing ones do not; those about flights, if one fails.
fn separation(asked: &[Asked]) -> String {
    let mut failing: Vec<&Asked> = asked.iter().filter(|asked| asked.verdict == Verdict::Failed).collect();
    if failing.iter().any(|asked| !asked.contains.contains(&Content::NoSpeed)) {
        failing.retain(|asked| !asked.contains.contains(&Content::NoSpeed));
    }
    let passing: Vec<&Asked> = asked.iter().filter(|asked| asked.verdict == Verdict::Passed).collect();
    let smallest = failing.iter().min_by_key(|asked| asked.contains.len());
    let smallest = smallest.map_or(String::new(), |asked| {
        let words: Vec<String> = asked.contains.iter().map(ToString::to_string).collect();
        format!("the smallest that fails is {} ({})", asked.id, words.join(", "))
    });
    let part = |asked: &[&Asked], content| {
        asked.iter().filter(|asked| asked.contains.contains(&content)).count() as f64 / asked.len().max(1) as f64
    };
    let best = Content::iter()
        .map(|content| (part(&failing, content) - part(&passing, content), content))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        // What they hold tells nothing of questions that all fail.
        Some((difference, content)) if difference > 0.5 && passing.len() * 10 >= failing.len() => {
            let (with, without) = (part(&failing, content), part(&passing, content));
            let (with, without) = ((100.0 * with).round(), (100.0 * without).round());
            format!(
                "{smallest}; `{content}` stands in {with} % of the failing and {without} % of the passing questions"
            )
        }
        _ => smallest,
    }
}

#[cfg(test)]
mod tests;
