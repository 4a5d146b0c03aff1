//! Is a solver right, and if not, what is wrong with it?
//!
//! The solver is asked generated questions whose answers are known (`questions`). An adaptive one is asked at three
//! tolerances and may err by [`ALLOWED`] times the tolerance and the condition of the problem; one of fixed steps is
//! asked on a ladder of steps, and its limit judged (`fixed_steps`). Where answers fail, each cause that is known
//! computes what it would have answered (`hypotheses`, `simulation`), and the one that explains them is named
//! (`causes`).

mod causes;
mod fixed_steps;
mod hypotheses;
mod questions;
mod simulation;

use std::collections::BTreeMap;

use serde::Serialize;
use strum::IntoEnumIterator;

pub use self::causes::{Cause, Certainty};
use self::causes::{Effort, Seen, causes};
use self::fixed_steps::{FINER, LADDER, Rung, coarsest_step, limit, order, pooled, rung_errors, schemes};
use self::hypotheses::How;
pub use self::questions::{Content, contents};
use self::questions::{Question, edge_questions, questions};
use super::enclosure;
use super::order::{OrderFit, StepError, fit};
use super::verdict::Verdict;
use crate::exchange::peers::process::ORDER_OF_ALL;
use crate::exchange::peers::wire::errors;
use crate::exchange::peers::{Peer, PeerAnswer, PeerFailure, PeerFault, PeerIdentity, PeerRequest};
use crate::integrators::{Boundaries, Detail, Enclosure, VelocityAt};
use crate::physics::{Criterion, Event, Outcome, Problem, Scene, Shown, State};

/// Relative tolerances at which an adaptive solver is asked.
pub const TOLERANCES: [f64; 3] = [1e-6, 1e-9, 1e-12];
/// Error allowed over the tolerance and the condition number. The worst of sound solvers measured: 135 (BDF).
pub const ALLOWED: f64 = 1e3;
/// Questions after which causes are looked for, and after which a certain one ends the asking.
const LOOKED_FROM: usize = 80;
/// Questions between two looks.
const LOOKED_EACH: usize = 40;
/// Times that a solver is started again after it died; one that fell silent is so many times as costly.
const RESTARTS_MAX: usize = 30;
const RESTARTS_OF_SILENCE: usize = 30;
/// Accuracies (relative error over the condition) of a solver that does not do what it is asked for.
const ACCURACIES: [f64; 4] = [1e-9, 1e-7, 1e-5, 1e-3];
/// Questions of fixed steps.
const FIXED_QUESTIONS: usize = 120;
/// Steps of all questions of fixed steps at most.
const STEPS_TOTAL: f64 = 1e6;
/// Questions that are asked at a far smaller step, and that step over the coarsest.
const FLOOR_QUESTIONS: usize = 8;
const FLOOR_STEP: f64 = 0.002;
/// Error over the condition above which one that does not fall is no round-off of 64-bit numbers, and how far above what
/// its order promises.
const FLOOR_MAX: f64 = 1e-8;
const FLOOR_EXCESS: f64 = 10.0;
/// Least order with which errors of a sound scheme fall.
const FLOOR_ORDER: f64 = 0.8;
/// An order claimed may exceed the one found by this part of it: the steps are not small for every question.
const ORDER_MARGIN: f64 = 0.15;
/// Digits up to which an answer has few.
const FEW_DIGITS: usize = 9;
/// Decimals up to which an answer has few.
const FEW_DECIMALS: usize = 8;

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
    /// Whether the events at their edges are asked too, of a solver that reads stages and is told a tolerance.
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
struct Answered<'a> {
    question: &'a Question,
    /// Setting (tolerance or step) and answer, or why there is none.
    answers: Vec<(f64, Result<PeerAnswer, String>)>,
}

/// Diagnoses `solver`; `progress` is called after each question with the number of questions asked and to be asked.
pub fn diagnose(solver: &mut dyn Solver, plan: Plan, progress: &dyn Fn(usize, usize)) -> Diagnosis {
    let identity = solver.identity();
    let peer = Subject {
        name: identity.name.clone(),
        version: identity.version.clone(),
        method: identity.method.clone(),
        command: solver.command(),
        fixed_step: identity.fixed_step,
        reads: if identity.reads_scene { "scene" } else { "stages" },
    };
    let mut all = questions(plan.seed, plan.questions, identity.reads_scene);
    if plan.asks_edges && !identity.fixed_step && !identity.reads_scene {
        all.extend(edge_questions());
    }
    let mut asking = Asking::new(solver);
    if identity.fixed_step {
        in_fixed_steps(&mut asking, peer, &identity, &all, progress)
    } else {
        at_tolerances(&mut asking, peer, &identity, &all, progress)
    }
}

/// Asks `solver`, which is told a tolerance, what lies at the edges, and `plan.questions` more; each is judged, and no
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
/// Faults that change an answer at the very number at which nothing is wrong, as sentences, and how many answers were looked at:
/// to `count` questions about stages and as many about scenes. A fault with another number would be named with a wrong one.
#[cfg(feature = "report")]
pub(crate) fn changed_by_nothing(seed: u64, count: usize) -> (usize, Vec<String>) {
    const LEFT: f64 = 1e-7;
    let all: Vec<Question> =
        [false, true].into_iter().flat_map(|of_scenes| questions(seed, count, of_scenes)).collect();
    let usable = all.iter().filter(|question| question.problem.impact_speed > 0.0 && !question.is_on_a_border());
    let usable: Vec<&Question> = usable.collect();
    let (mut answers, mut changed) = (0, Vec::new());
    for fault in hypotheses::hypotheses() {
        let numbers = fault.parameter.neutral();
        let mut is_changed = |question: &&Question, number: f64| {
            let Some((problem, found)) = hypotheses::predict(question, &[(fault, number)], How::Exact) else {
                return false;
            };
            answers += 1;
            let off = errors(found.end, question.exact.end, problem.impact_speed);
            (0..3).any(|i| !(off[i].abs() <= LEFT * question.conditions[i]))
        };
        let by: Option<Vec<&&Question>> =
            numbers.iter().map(|number| usable.iter().find(|question| is_changed(question, *number))).collect();
        if let Some((question, number)) = by.and_then(|by| Some((*by.first()?, *numbers.first()?))) {
            changed.push(format!("{} ({})", fault.says(number), question.id));
        }
    }
    (answers, changed)
}

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

/// How an answer of an adaptive solver fares.
struct Judged {
    verdict: Verdict,
    errors: [f64; 3],
    limits: [f64; 3],
    reason: String,
    /// Whether only its outcome is wrong.
    is_misnamed: bool,
    /// Whether only the events listed are.
    is_in_events: bool,
}

fn judge(question: &Question, rtol: f64, answer: &PeerAnswer) -> Judged {
    let (problem, exact) = (&question.problem, &question.exact);
    let end = State { time: answer.time_s, depth: answer.depth_m, velocity: answer.velocity_m_s };
    let errors = errors(end, exact.end, problem.impact_speed);
    let asked = request(question, rtol);
    let absolute = if exact.end.depth > 0.0 { asked.atol[0] / exact.end.depth } else { 0.0 };
    let conditions = crate::exchange::peers::wire::conditioning(exact.end, problem);
    let limits: [f64; 3] =
        std::array::from_fn(|i| ALLOWED * (rtol + absolute.min(1.0)) * conditions[i].max(question.conditions[i]));
    let judged = |verdict, reason: String, is_misnamed| Judged {
        verdict,
        errors,
        limits,
        reason,
        is_misnamed,
        is_in_events: false,
    };
    let in_events = |reason: String| Judged { is_in_events: true, ..judged(Verdict::Failed, reason, false) };
    let are_right = (0..3).all(|i| errors[i].abs() <= limits[i]);
    if !answer.outcome.agrees_with(exact.outcome) {
        let is_open = exact.exit_margin.is_some_and(|margin| margin.abs() <= ALLOWED * rtol * question.conditions[2]);
        if is_open {
            return judged(Verdict::Skipped, String::new(), false);
        }
        let exit =
            if problem.has_exit() { format!(", the exit at {:.9} m", problem.exit_depth) } else { String::new() };
        let said = format!(
            "says {} at x = {:.9} m, V = {:.6} m/s{exit}; {} is right",
            answer.outcome, end.depth, end.velocity, exact.outcome
        );
        return judged(Verdict::Failed, said, are_right);
    }
    if let Some(worst) = (0..3)
        .filter(|i| !(errors[*i].abs() <= limits[*i]))
        .max_by(|a, b| (errors[*a].abs() / limits[*a]).total_cmp(&(errors[*b].abs() / limits[*b])))
    {
        let said = format!("{} off by {:+.2e}, limit {:.1e}", QUANTITIES[worst], errors[worst], limits[worst]);
        let proof = proof(problem, worst, end).map_or_else(String::new, |proof| format!("; {proof}"));
        return judged(Verdict::Failed, said + &proof, false);
    }
    if !answer.has_events_in_order(&asked) {
        return in_events("the events listed are not of the stages, each once, in the order of time".to_owned());
    }
    // An end that is reached with next to no speed is reached or not within the tolerance.
    let worst_limit = limits.iter().copied().fold(0.0, f64::max);
    let is_open = |event: &Event| (event.state.velocity / problem.impact_speed).powi(2) <= worst_limit;
    if let Some(event) = answer.left_out(exact, problem).filter(|event| !is_open(event)) {
        let said = format!("lists events, and not the {} at x = {:.9} m", event.kind.name(), event.state.depth);
        return in_events(said);
    }
    // The time at which next to no speed is left is known to the root of the tolerance.
    let mut sure = answer.clone();
    sure.events.retain(|event| !is_open(event));
    let listed = sure.differences_from(exact, problem).unwrap_or_default();
    let off = listed.iter().find(|difference| !(difference.relative <= 10.0 * worst_limit * difference.conditioning));
    if let Some(difference) = off {
        let said = format!("the event listed is off: {} by {:+.2e}", difference.quantity, difference.signed);
        return in_events(said);
    }
    judged(Verdict::Passed, String::new(), false)
}

/// What is proved of the answer's quantity `index` of [`QUANTITIES`]; the numbers of a question are exact.
fn proof(problem: &Problem, index: usize, end: State) -> Option<String> {
    let flight = Enclosure.enclose(&problem.cast(), Detail::End).ok()?;
    let (value, ball, unit) = [
        (end.depth, flight.end.depth, "m"),
        (end.time, flight.end.time, "s"),
        (end.velocity, flight.end.velocity, "m/s"),
    ][index];
    let is_proved = flight.outcome != Outcome::Undecided;
    let said =
        || enclosure::sentence(&Shown(value).to_string(), value, 0.0, (ball.lower().max(0.0), ball.upper()), unit);
    is_proved.then(said).flatten()
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

/// Diagnosis of a solver that is told a tolerance.
fn at_tolerances(
    asking: &mut Asking<'_>,
    peer: Subject,
    identity: &PeerIdentity,
    all: &[Question],
    progress: &dyn Fn(usize, usize),
) -> Diagnosis {
    let mut answered: Vec<Answered<'_>> = Vec::new();
    let mut found = Vec::new();
    for (index, question) in all.iter().enumerate() {
        answered.push(asking.at_tolerances(question));
        progress(index + 1, all.len());
        let asked = index + 1;
        if asking.is_gone {
            break;
        }
        if asked >= LOOKED_FROM && asked % LOOKED_EACH == 0 && asked < all.len() {
            found = causes_of(&answered, identity, all, Effort::Singles);
            if found.first().is_some_and(|cause| cause.certainty == Certainty::Certain) {
                break;
            }
        }
    }
    let asked: Vec<Asked> = answered.iter().map(row).collect();
    let counts = count(&asked, all.len());
    let verdict = match () {
        () if counts.failed > 0 => Verdict::Failed,
        () if counts.passed == 0 => Verdict::Undecided,
        () => Verdict::Passed,
    };
    if verdict == Verdict::Failed && found.first().is_none_or(|cause| cause.certainty != Certainty::Certain) {
        found = causes_of(&answered, identity, all, Effort::Pairs);
    }
    if verdict != Verdict::Failed {
        found.clear();
    }
    finish(Diagnosis {
        verdict,
        peer,
        counts,
        causes: found,
        scheme: None,
        orders: Vec::new(),
        separation: None,
        questions: asked,
    })
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
    let failed = diagnosis.counts.failed;
    let cause = Cause {
        id: "unknown".to_owned(),
        factor: None,
        certainty: Certainty::Possible,
        statement: format!("no cause that is known explains the failing answers; {separation}"),
        explains: 0,
        of: failed,
        largest_difference: None,
    };
    diagnosis.separation = Some(separation);
    diagnosis.causes.insert(0, cause);
    diagnosis
}

/// The smallest question that fails, and what failing questions hold that passing ones do not.
fn separation(asked: &[Asked]) -> String {
    let failing: Vec<&Asked> = asked.iter().filter(|asked| asked.verdict == Verdict::Failed).collect();
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
        // What all fail is not told apart by what they hold.
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

/// The row of a question at tolerances: the tightest answer that fails, else the tightest.
fn row(answered: &Answered<'_>) -> Asked {
    let question = answered.question;
    let mut asked = Asked {
        id: question.id.clone(),
        contains: question.contains.clone(),
        verdict: Verdict::Skipped,
        rtol: None,
        dt_s: None,
        expected: expected(question),
        answered: None,
        relative_error: None,
        limit: None,
        reason: String::new(),
    };
    for (rtol, answer) in &answered.answers {
        match answer {
            Err(why) => {
                asked.verdict = Verdict::Failed;
                if asked.reason.is_empty() {
                    asked.reason.clone_from(why);
                    asked.rtol = Some(*rtol);
                }
            }
            Ok(answer) => {
                let judged = judge(question, *rtol, answer);
                let is_shown = match judged.verdict {
                    Verdict::Failed => true,
                    Verdict::Passed => asked.verdict != Verdict::Failed,
                    _ => false,
                };
                if is_shown {
                    asked.verdict = judged.verdict;
                    asked.rtol = Some(*rtol);
                    asked.answered = Some(end_of(answer));
                    asked.relative_error = Some(Each::of(judged.errors));
                    asked.limit = Some(Each::of(judged.limits));
                    asked.reason = judged.reason;
                }
            }
        }
    }
    asked
}

/// Numbers of all answers that came, at the tightest tolerance.
fn numbers(answered: &[Answered<'_>]) -> Vec<f64> {
    let tightest =
        |answered: &Answered<'_>| answered.answers.last().and_then(|(_, answer)| answer.as_ref().ok().cloned());
    let all = answered.iter().filter_map(tightest);
    all.flat_map(|answer| [answer.depth_m, answer.time_s, answer.velocity_m_s])
        .filter(|number| *number != 0.0)
        .collect()
}

fn simple(id: &str, statement: String, certainty: Certainty, explains: usize, of: usize) -> Cause {
    Cause { id: id.to_owned(), factor: None, certainty, statement, explains, of, largest_difference: None }
}

/// Significant digits, and decimals, of `number` as it is written.
fn digits(number: f64) -> (usize, usize) {
    let text = format!("{number:e}");
    let mantissa = text.split('e').next().unwrap_or_default();
    let significant = mantissa.chars().filter(char::is_ascii_digit).count();
    let plain = number.to_string();
    (significant, plain.split_once('.').map_or(0, |(_, behind)| behind.len()))
}

/// What the numbers themselves show: single precision, or few digits.
fn of_numbers(numbers: &[f64], failed: usize) -> Option<Cause> {
    if numbers.len() < 10 {
        return None;
    }
    if numbers.iter().all(|number| f64::from(*number as f32) == *number) {
        let statement = "every number is one of single precision (f32)".to_owned();
        return Some(simple("single-precision", statement, Certainty::Certain, failed, failed));
    }
    let all: Vec<(usize, usize)> = numbers.iter().map(|number| digits(*number)).collect();
    let most = all.iter().map(|(significant, _)| *significant).max().unwrap_or(0);
    let decimals = all.iter().map(|(_, decimals)| *decimals).max().unwrap_or(0);
    let statement = if most <= FEW_DIGITS {
        format!("numbers are printed with at most {most} digits: print 17")
    } else if decimals <= FEW_DECIMALS {
        format!("numbers are printed with at most {decimals} decimals: print 17 digits")
    } else {
        return None;
    };
    Some(simple("few-digits", statement, Certainty::Certain, failed, failed))
}

/// Causes of the answers of an adaptive solver.
fn causes_of(answered: &[Answered<'_>], identity: &PeerIdentity, all: &[Question], effort: Effort) -> Vec<Cause> {
    let rows: Vec<Asked> = answered.iter().map(row).collect();
    let failed = rows.iter().filter(|row| row.verdict == Verdict::Failed).count();
    let silent = rows.iter().filter(|row| row.verdict == Verdict::Failed && row.answered.is_none()).count();
    if failed == 0 {
        return Vec::new();
    }
    let others: Vec<&Question> = all.iter().collect();
    let of_numbers = of_numbers(&numbers(answered), failed);
    let at = |accuracy: f64| seen(answered, |_| accuracy);
    let failing = |seen: &[Seen<'_>]| seen.iter().filter(|seen| seen.fails).count();
    let named = |seen: &[Seen<'_>], effort: Effort| {
        let found = causes(seen, identity.reads_scene, &others, effort);
        found.first().is_some_and(|cause| cause.certainty != Certainty::Possible).then_some(found)
    };
    let no_answer = (silent > 0).then(|| {
        let words = rows.iter().find(|row| row.answered.is_none()).map_or("", |row| row.reason.as_str());
        let statement = format!(
            "{} no answer: {words}",
            if silent == 1 { "1 question has".to_owned() } else { format!("{silent} questions have") }
        );
        let certainty = if silent == failed { Certainty::Likely } else { Certainty::Possible };
        simple("no-answer", statement, certainty, silent, failed)
    });
    let exactly = at(ACCURACIES[0]);
    if let Some(cause) = of_events(answered, failed) {
        return vec![cause];
    }
    let mut found = named(&exactly, Effort::Singles);
    // Small errors alone are those of a solver that does not do what the tolerance asks for, unless they are in few
    // answers, and those are sure of themselves.
    let is_of_few = 2 * failed < rows.len() && are_sure(answered);
    if found.is_none()
        && !is_of_few
        && 10 * silent <= failed
        && failing(&at(ACCURACIES[3])) == 0
        && failing(&exactly) > 0
    {
        let (same, compared) = sameness(answered);
        return vec![of_numbers.unwrap_or_else(|| {
            if compared >= 10 && same * 10 >= compared * 9 {
                let statement = "answers are the same at every tolerance, and err by more than it allows".to_owned();
                simple("tolerance-ignored", statement, Certainty::Certain, failed, failed)
            } else {
                inaccurate(answered, failed)
            }
        })];
    }
    if found.is_none() && converges(answered) {
        return vec![inaccurate(answered, failed)];
    }
    // An input that is off a little, in every answer by another factor, is what an inaccurate solver looks like.
    let as_likely = |mut causes: Vec<Cause>| {
        for cause in &mut causes {
            cause.certainty = cause.certainty.max(Certainty::Likely);
        }
        (causes.first()?.id != "input-rounded").then_some(causes)
    };
    // To within what its answers at two tolerances differ by, unless the numbers themselves say why they differ.
    if found.is_none() && of_numbers.is_none() {
        found = named(&seen(answered, |one| spread(one).max(ACCURACIES[0])), Effort::Singles).and_then(as_likely);
    }
    // Behind small errors of everything there may be a great one of something.
    let mut before = failing(&exactly);
    for accuracy in &ACCURACIES[1..] {
        let seen = at(*accuracy);
        let now = failing(&seen);
        if found.is_none() && now > 0 && 10 * now < 9 * before {
            before = now;
            found = named(&seen, Effort::Singles).and_then(as_likely).map(|mut causes| {
                causes.extend(of_numbers.clone());
                causes
            });
        }
    }
    if found.is_none() && effort == Effort::Pairs {
        found = named(&exactly, Effort::Pairs);
    }
    let mut found = found.unwrap_or_else(|| {
        let possible = causes(&exactly, identity.reads_scene, &others, Effort::Singles);
        of_numbers.into_iter().chain(possible).collect()
    });
    found.extend(no_answer);
    found
}

/// Every end is right, and the events listed are not.
fn of_events(answered: &[Answered<'_>], failed: usize) -> Option<Cause> {
    let failing = answered.iter().filter_map(|Answered { question, answers }| {
        let judge = |(rtol, answer): &(f64, Result<PeerAnswer, String>)| match answer {
            Ok(answer) => Some(judge(question, *rtol, answer)).filter(|judged| judged.verdict == Verdict::Failed),
            Err(_) => None,
        };
        answers.iter().rev().find_map(judge)
    });
    let failing: Vec<Judged> = failing.collect();
    let first = failing.first()?;
    let statement = format!("every end is right, and the events listed are not: {}", first.reason);
    let all = failing.len() == failed && failing.iter().all(|judged| judged.is_in_events);
    all.then(|| simple("event-list", statement, Certainty::Certain, failed, failed))
}

/// Whether most failing answers differ far less between the two tightest tolerances than from the right ones.
fn are_sure(answered: &[Answered<'_>]) -> bool {
    let (mut sure, mut all) = (0, 0);
    for one in answered {
        let Some((rtol, Ok(answer))) = one.answers.last() else { continue };
        let judged = judge(one.question, *rtol, answer);
        if judged.verdict == Verdict::Failed && !judged.is_in_events {
            let error = (0..3).map(|i| judged.errors[i].abs() / one.question.conditions[i]).fold(0.0, f64::max);
            all += 1;
            sure += usize::from(spread(one) < 0.1 * error);
        }
    }
    2 * sure > all
}

/// Whether the errors of failing answers fall with the tolerance, as those of no wrong equation do.
fn converges(answered: &[Answered<'_>]) -> bool {
    let (mut fall, mut all) = (0, 0);
    for Answered { question, answers } in answered {
        let error = |which: usize| {
            let (rtol, answer) = answers.get(which)?;
            let judged = judge(question, *rtol, answer.as_ref().ok()?);
            let error = (0..3).map(|i| judged.errors[i].abs() / question.conditions[i]).fold(0.0, f64::max);
            Some((error, judged.verdict == Verdict::Failed))
        };
        // Where the loosest answer is as good as it should be, the steps are bounded by something else.
        if let (Some((loose, _)), Some((tight, true))) = (error(0), error(TOLERANCES.len() - 1))
            && loose.max(tight) > TOLERANCES[0]
        {
            all += 1;
            fall += usize::from(tight < 0.1 * loose);
        }
    }
    all > 0 && 4 * fall >= 3 * all
}

/// The answers that came, an answer failing where it is beyond its limit and off by more than `accuracy`.
fn seen<'a>(answered: &[Answered<'a>], accuracy: impl Fn(&Answered<'a>) -> f64) -> Vec<Seen<'a>> {
    let mut all = Vec::new();
    // Without speed there is nothing to simulate.
    let is_usable = |question: &Question| question.problem.impact_speed > 0.0 && !question.is_on_a_border();
    for one in answered.iter().filter(|one| is_usable(one.question)) {
        let Answered { question, answers } = one;
        let accuracy = accuracy(one);
        // The tightest answer that fails, else the tightest.
        let mut chosen: Option<Seen<'_>> = None;
        for (rtol, answer) in answers {
            let Ok(answer) = answer else { continue };
            let judged = judge(question, *rtol, answer);
            if judged.verdict == Verdict::Skipped {
                continue;
            }
            let of_answer = (ALLOWED * rtol).max(accuracy);
            let is_far = (0..3).any(|i| !(judged.errors[i].abs() <= of_answer * question.conditions[i]));
            let fails = judged.verdict == Verdict::Failed && (is_far || judged.is_misnamed);
            if fails || chosen.as_ref().is_none_or(|chosen| !chosen.fails) {
                chosen = Some(Seen {
                    question,
                    answer: end_of(answer).state,
                    how: How::Exact,
                    accuracy: of_answer,
                    fails,
                    is_misnamed: judged.is_misnamed,
                });
            }
        }
        all.extend(chosen);
    }
    all
}

/// How far the answers at the two tightest tolerances lie apart, over the condition.
fn spread(Answered { question, answers }: &Answered<'_>) -> f64 {
    let ends: Vec<State> =
        answers.iter().rev().filter_map(|(_, answer)| Some(end_of(answer.as_ref().ok()?).state)).collect();
    let [tight, looser, ..] = ends[..] else { return 0.0 };
    let apart = errors(looser, tight, question.problem.impact_speed);
    let relative = (0..3).map(|i| apart[i].abs() / question.conditions[i]).fold(0.0, f64::max);
    if relative.is_finite() { relative } else { 0.0 }
}

/// How many questions have one answer at all tolerances, and how many are compared.
fn sameness(answered: &[Answered<'_>]) -> (usize, usize) {
    let (mut same, mut compared) = (0, 0);
    for Answered { answers, .. } in answered {
        let ends: Vec<State> =
            answers.iter().filter_map(|(_, answer)| answer.as_ref().ok()).map(|answer| end_of(answer).state).collect();
        if let [first, rest @ ..] = &ends[..]
            && !rest.is_empty()
        {
            compared += 1;
            same += usize::from(rest.iter().all(|end| end == first));
        }
    }
    (same, compared)
}

/// The cause of errors that are small, and beyond the tolerance.
fn inaccurate(answered: &[Answered<'_>], failed: usize) -> Cause {
    // Errors over the condition at each tolerance: their medians.
    let median = |which: usize| {
        let mut all: Vec<f64> = answered
            .iter()
            .filter_map(|Answered { question, answers }| {
                let (rtol, answer) = answers.get(which)?;
                let judged = judge(question, *rtol, answer.as_ref().ok()?);
                Some((0..3).map(|i| judged.errors[i].abs() / question.conditions[i]).fold(0.0, f64::max))
            })
            .collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() * 3 / 4).copied().unwrap_or(0.0)
    };
    let errors = [0, 1, 2].map(median);
    let stays = errors[2] > 0.3 * errors[0] && errors[2] > 1e-6;
    let rises = errors[2] > 0.1 * errors[1] && (1e-8..1e-4).contains(&errors[2]);
    let [loose, middle, tight] = errors.map(|error| format!("{error:.0e}"));
    let found = format!("errors of {loose}, {middle} and {tight} at tolerances of 1e-6, 1e-9 and 1e-12");
    if stays {
        let statement = format!("{found}: they do not follow the tolerance");
        simple("tolerance-ignored", statement, Certainty::Likely, failed, failed)
    } else if rises {
        let statement = format!("{found}: they stop falling far above the round-off of 64-bit numbers");
        simple("single-precision", statement, Certainty::Likely, failed, failed)
    } else {
        // A thousandth of the tolerance between each two.
        let power = (errors[0] / errors[2]).log10() / (TOLERANCES[0] / TOLERANCES[2]).log10();
        let falls = if power.is_finite() && power > 0.05 && power < 0.9 {
            format!("they fall as the tolerance to the power of {power:.1}")
        } else {
            "the error is not what the tolerance asks for".to_owned()
        };
        let statement = format!("{found}: {falls}");
        simple("tolerance-missed", statement, Certainty::Likely, failed, failed)
    }
}

/// Diagnosis of a solver that is told its step.
fn in_fixed_steps(
    asking: &mut Asking<'_>,
    peer: Subject,
    identity: &PeerIdentity,
    all: &[Question],
    progress: &dyn Fn(usize, usize),
) -> Diagnosis {
    let usable: Vec<(&Question, f64)> =
        all.iter().filter_map(|question| Some((question, coarsest_step(question)?))).take(FIXED_QUESTIONS).collect();
    let mut steps = 0.0;
    let mut laddered: Vec<Laddered<'_>> = Vec::new();
    for (index, (question, coarsest)) in usable.iter().enumerate() {
        let mut next = Laddered { question, coarsest: *coarsest, rungs: Vec::new(), failure: None };
        steps += next.climb(asking, &LADDER);
        // A limit that seems wrong is looked at again.
        if next.failure.is_none() && next.is(fixed_steps::Limit::is_suspect) {
            steps += next.climb(asking, &FINER);
        }
        laddered.push(next);
        progress(index + 1, usable.len());
        if asking.is_gone || steps > STEPS_TOTAL {
            break;
        }
    }
    let rows: Vec<Asked> = laddered.iter().map(Laddered::row).collect();
    let counts = count(&rows, usable.len());
    let right: Vec<(&Question, &[Rung])> = laddered
        .iter()
        .zip(&rows)
        .filter(|(_, row)| row.verdict == Verdict::Passed)
        .map(|(laddered, _)| (laddered.question, &laddered.rungs[..]))
        .collect();
    let reproducing = schemes(&right);
    let orders = orders(&right, identity);
    let fails_an_order = orders.iter().any(|order| order.verdict == Verdict::Failed);
    let floor = floor(asking, &right)
        .or_else(|| of_numbers(&laddered.iter().flat_map(Laddered::numbers).collect::<Vec<_>>(), counts.failed));
    let verdict = match () {
        () if counts.failed > 0 || fails_an_order || floor.is_some() => Verdict::Failed,
        () if counts.passed == 0 || counts.undecided > counts.passed => Verdict::Undecided,
        () => Verdict::Passed,
    };
    let mut causes: Vec<Cause> = floor.into_iter().collect();
    let is_same = |one: &&Laddered<'_>| one.rungs.windows(2).all(|pair| pair[0].answer == pair[1].answer);
    if counts.failed > 0 && laddered.iter().filter(is_same).count() * 10 >= laddered.len() * 9 {
        let statement = "answers are the same whatever the step: dt_s is ignored".to_owned();
        causes.push(simple("step-ignored", statement, Certainty::Certain, counts.failed, counts.failed));
    } else if counts.failed > 0 {
        causes.extend(fixed_causes(&laddered, &rows, &reproducing, identity, all));
    }
    let scheme = reproducing.first();
    // What has no order is lowered by nothing else.
    if counts.failed == 0 && causes.is_empty() {
        causes.extend(what_lowers(scheme.map(|(scheme, _)| *scheme), &right, &orders));
    }
    let scheme = scheme.map(|(scheme, largest)| Reproduced {
        name: scheme.name(),
        velocity: scheme.velocity().map(VelocityAt::name),
        events: Some(scheme.events().name()),
        largest_difference: *largest,
    });
    let scheme = scheme.filter(|_| counts.failed == 0);
    let diagnosis = Diagnosis { verdict, peer, counts, causes, scheme, orders, separation: None, questions: rows };
    if counts.failed > 0 { finish(diagnosis) } else { diagnosis }
}

/// A question of fixed steps and its answers.
struct Laddered<'a> {
    question: &'a Question,
    coarsest: f64,
    rungs: Vec<Rung>,
    failure: Option<String>,
}

impl Laddered<'_> {
    /// Asks on `parts` of the coarsest step; the number of steps that took.
    fn climb(&mut self, asking: &mut Asking<'_>, parts: &[f64]) -> f64 {
        let mut steps = 0.0;
        for part in parts {
            let step = part * self.coarsest;
            steps += self.question.exact.end.time / step;
            let asked = PeerRequest { dt_s: Some(step), ..request(self.question, TOLERANCES[0]) };
            match asking.ask(&asked) {
                Ok(answer) => self.rungs.push(Rung {
                    step,
                    answer: end_of(&answer).state,
                    is_outcome_right: answer.outcome.agrees_with(self.question.exact.outcome),
                }),
                Err(why) => {
                    self.failure = (!asking.may_decline(self.question)).then_some(why);
                    break;
                }
            }
        }
        steps
    }

    fn numbers(&self) -> Vec<f64> {
        let answers = self.rungs.iter().map(|rung| rung.answer);
        answers.flat_map(|end| [end.depth, end.time, end.velocity]).filter(|number| *number != 0.0).collect()
    }

    fn limits(&self) -> [Option<fixed_steps::Limit>; 3] {
        [0, 1, 2].map(|which| limit(self.question, &self.rungs, which))
    }

    fn is(&self, of: impl Fn(&fixed_steps::Limit, f64) -> bool) -> bool {
        let wrong_outcome = self.rungs.last().is_some_and(|rung| !rung.is_outcome_right);
        wrong_outcome || (0..3).any(|i| self.limits()[i].is_some_and(|limit| of(&limit, self.question.conditions[i])))
    }

    fn row(&self) -> Asked {
        let question = self.question;
        let last = self.rungs.iter().min_by(|a, b| a.step.total_cmp(&b.step));
        let limits = self.limits();
        let is_wrong = |i: usize| limits[i].is_some_and(|limit| limit.is_wrong(question.conditions[i]));
        let wrong = (0..3).find(|i| is_wrong(*i));
        let suspect = (0..3).find(|i| limits[*i].is_some_and(|limit| limit.is_suspect(question.conditions[*i])));
        let finest: Vec<&Rung> = self.rungs.iter().rev().take(2).collect();
        let (verdict, reason) = if let Some(why) = &self.failure {
            (Verdict::Failed, why.clone())
        } else if finest.is_empty() {
            (Verdict::Skipped, String::new())
        } else if finest.iter().all(|rung| !rung.is_outcome_right) {
            (Verdict::Failed, format!("the outcome at small steps is not {}", question.exact.outcome))
        } else if let Some(i) = wrong {
            let error = limits[i].map_or(f64::NAN, |limit| limit.error);
            (Verdict::Failed, format!("{} goes to a limit that is off by {error:+.2e}", QUANTITIES[i]))
        } else if suspect.is_some() || finest.iter().any(|rung| !rung.is_outcome_right) {
            (Verdict::Undecided, "the steps are too large to tell the limit".to_owned())
        } else {
            (Verdict::Passed, String::new())
        };
        let answered = last.map(|rung| End {
            outcome: if rung.is_outcome_right { question.exact.outcome } else { other_outcome(question) },
            state: rung.answer,
        });
        Asked {
            id: question.id.clone(),
            contains: question.contains.clone(),
            verdict,
            rtol: None,
            dt_s: last.map(|rung| rung.step),
            expected: expected(question),
            answered,
            relative_error: Some(Each::of(limits.map(|limit| limit.map_or(f64::NAN, |limit| limit.error))))
                .filter(|each| each.depth.is_finite() && each.time.is_finite() && each.velocity.is_finite()),
            limit: None,
            reason,
        }
    }
}

/// The outcome that is not the right one.
fn other_outcome(question: &Question) -> Outcome {
    if question.exact.outcome == Outcome::Perforated { Outcome::Stopped } else { Outcome::Perforated }
}

/// Orders over the questions that pass, and how the ones claimed fare.
fn orders(right: &[(&Question, &[Rung])], identity: &PeerIdentity) -> Vec<QuantityOrder> {
    let claims: &BTreeMap<String, f64> = &identity.claimed_orders;
    let of = |which: usize| {
        let quantity = QUANTITIES[which];
        let formal = claims.get(quantity).or_else(|| claims.get(ORDER_OF_ALL)).copied();
        let errors = pooled(right, which);
        let fitted: Option<OrderFit> = fit(&errors).ok();
        // Large steps may not show the order yet.
        let small = slope(&errors[errors.len() / 2..]);
        let line = fitted.as_ref().and_then(|fitted| fitted.line);
        let is_lower = |formal: f64| Some(is_short_of(formal, line.as_ref()?.interval95, small));
        let verdict = match formal {
            None => Verdict::Skipped,
            Some(formal) => match is_lower(formal) {
                Some(true) => Verdict::Failed,
                Some(false) => Verdict::Passed,
                // No errors above round-off: nothing contradicts the claim.
                None => Verdict::Skipped,
            },
        };
        QuantityOrder {
            quantity,
            formal_order: formal,
            observed_order: line.as_ref().map(|line| line.order),
            interval: line.as_ref().map(|line| line.interval95),
            class: fitted.as_ref().map_or(super::order::Class::AtFloor, |fitted| fitted.class),
            verdict,
        }
    };
    [0, 1, 2].map(of).into()
}

/// Whether the whole interval of an order lies below the formal one, and what the smallest steps show does too.
fn is_short_of(formal: f64, interval95: [f64; 2], small: Option<f64>) -> bool {
    let is_below = |order: f64| order < (1.0 - ORDER_MARGIN) * formal;
    let [_, high] = interval95;
    is_below(high) && small.is_some_and(is_below)
}

/// The slope of ln error over ln step; `None` for fewer than two errors above zero.
fn slope(errors: &[StepError]) -> Option<f64> {
    let points: Vec<(f64, f64)> =
        errors.iter().filter(|point| point.error > 0.0).map(|point| (point.step.ln(), point.error.ln())).collect();
    let count = points.len() as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let over: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let under: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    Some(over / under).filter(|slope| slope.is_finite())
}

/// Causes of the limits of a solver of fixed steps.
fn fixed_causes(
    laddered: &[Laddered<'_>],
    rows: &[Asked],
    reproducing: &[(crate::studies::scheme_of_table::Scheme, f64)],
    identity: &PeerIdentity,
    all: &[Question],
) -> Vec<Cause> {
    let others: Vec<&Question> = all.iter().collect();
    let answered = || laddered.iter().zip(rows).filter(|(laddered, _)| laddered.failure.is_none());
    // Step by step, where the passing answers show which scheme it is.
    for (scheme, _) in reproducing.iter().take(3) {
        let mut seen = Vec::new();
        for (laddered, row) in answered().filter(|(_, row)| row.verdict != Verdict::Undecided) {
            for rung in [laddered.rungs.first(), laddered.rungs.get(LADDER.len() - 1)].into_iter().flatten() {
                seen.push(Seen {
                    question: laddered.question,
                    answer: rung.answer,
                    how: How::Scheme(*scheme, rung.step),
                    accuracy: fixed_steps::REPRODUCED,
                    fails: row.verdict == Verdict::Failed,
                    is_misnamed: false,
                });
            }
        }
        let causes = causes(&seen, identity.reads_scene, &others, Effort::Singles);
        if causes.first().is_some_and(|cause| cause.certainty != Certainty::Possible) {
            return causes;
        }
    }
    // By the limits, as far as they are known.
    let mut seen = Vec::new();
    for (laddered, row) in answered() {
        let question = laddered.question;
        let limits = laddered.limits();
        let [Some(depth), Some(time), Some(velocity)] = limits else { continue };
        let right = question.exact.end;
        let answer = State {
            depth: right.depth * (1.0 + depth.error),
            time: right.time * (1.0 + time.error),
            velocity: right.velocity + question.problem.impact_speed * velocity.error,
        };
        let sure =
            |i: usize| limits[i].map_or(f64::INFINITY, |limit| 6.0 * limit.standard_error / question.conditions[i]);
        let accuracy = sure(0).max(sure(1)).max(sure(2)).max(1e-9);
        let finest = laddered.rungs.iter().min_by(|a, b| a.step.total_cmp(&b.step));
        // Where the outcome is another, the limit of the numbers is that of a flight that ends elsewhere.
        let answer = match finest {
            Some(rung) if !rung.is_outcome_right => State { ..rung.answer },
            _ => answer,
        };
        let is_other = finest.is_some_and(|rung| !rung.is_outcome_right);
        if row.verdict == Verdict::Undecided {
            continue;
        }
        seen.push(Seen {
            question,
            answer,
            how: How::Exact,
            accuracy: if is_other { 0.1 } else { accuracy },
            fails: row.verdict == Verdict::Failed,
            is_misnamed: false,
        });
    }
    causes(&seen, identity.reads_scene, &others, Effort::Pairs)
}

/// The cause of errors that no longer fall with the step, far above the round-off of 64-bit numbers: a few questions are
/// asked again at a far smaller step.
fn floor(asking: &mut Asking<'_>, right: &[(&Question, &[Rung])]) -> Option<Cause> {
    let orders = [0, 1, 2].map(|which| order(right, which).map_or(FLOOR_ORDER, |order| (order - 0.2).max(FLOOR_ORDER)));
    let (mut compared, mut stays, mut largest) = (0, [0; 3], [0.0_f64; 3]);
    for (question, rungs) in right.iter().take(FLOOR_QUESTIONS) {
        let Some(coarsest) = rungs.first() else { continue };
        let asked = PeerRequest { dt_s: Some(FLOOR_STEP * coarsest.step), ..request(question, TOLERANCES[0]) };
        let Ok(answer) = asking.ask(&asked) else { continue };
        let found = errors(end_of(&answer).state, question.exact.end, question.problem.impact_speed);
        compared += 1;
        // Of several steps, since one may be right by chance.
        let before = &rung_errors(question, rungs)[LADDER.len() / 2..LADDER.len()];
        let ratio = LADDER[LADDER.len() / 2] / FLOOR_STEP;
        for which in 0..3 {
            let relative = found[which].abs() / question.conditions[which];
            let expected = before.iter().map(|all| all[which].abs()).fold(0.0, f64::max) / ratio.powf(orders[which]);
            if relative > FLOOR_MAX && found[which].abs() > FLOOR_EXCESS * expected {
                stays[which] += 1;
                largest[which] = largest[which].max(relative);
            }
        }
    }
    let which = (0..3).max_by_key(|which| stays[*which]).filter(|which| 2 * stays[*which] > compared)?;
    let statement = format!(
        "the error of the {} does not fall below {:.0e} with the step: round-off far above that of 64-bit numbers, as of a \
         sum in single precision",
        QUANTITIES[which], largest[which]
    );
    Some(simple("round-off", statement, Certainty::Likely, stays[which], compared))
}

/// What lowers the order of a sound scheme.
fn what_lowers(
    scheme: Option<crate::studies::scheme_of_table::Scheme>,
    right: &[(&Question, &[Rung])],
    orders: &[QuantityOrder],
) -> Vec<Cause> {
    let of = right.len();
    let with = |content: Content| right.iter().filter(|(question, _)| question.contains.contains(&content)).count();
    let cause =
        |id: &str, statement: &str, certainty, explains| simple(id, statement.to_owned(), certainty, explains, of);
    let mut causes = Vec::new();
    if let Some(scheme) = scheme {
        let certain = Certainty::Certain;
        if scheme.velocity() == Some(VelocityAt::LaggedHalfStep) && with(Content::Drag) + with(Content::Viscosity) > 0 {
            let statement = "the force is evaluated with V half a step behind: order 1 wherever it depends on V";
            causes.push(cause("drag-lagged", statement, certain, with(Content::Drag).max(with(Content::Viscosity))));
        }
        match scheme.name() {
            "euler" => {
                let statement = "the scheme is forward Euler, of order 1";
                causes.push(cause("first-order-scheme", statement, certain, of));
            }
            "semi-implicit-euler" => {
                let statement = "the scheme is semi-implicit Euler, of order 1: central difference started without its first half step of V is the same";
                causes.push(cause("start-kick", statement, certain, of));
            }
            _ => {}
        }
        if scheme.events() == Boundaries::StepEnd {
            for (id, content, what) in [
                ("stage-end-late", Content::StageEnd, "the end of a stage"),
                ("exit-late", Content::Exit, "the exit"),
                ("rest-late", Content::Rest, "rest"),
            ] {
                if with(content) > 0 {
                    let statement = format!("{what} is taken at the end of the step that passes it: order 1");
                    causes.push(simple(id, statement, certain, with(content), of));
                }
            }
        }
        return causes;
    }
    let first_order = orders.iter().any(|order| order.observed_order.is_some_and(|order| order < 1.5));
    if !first_order {
        let below = orders.iter().find(|order| order.verdict == Verdict::Failed);
        causes.extend(below.map(|below| {
            let (found, claimed) = (below.observed_order.unwrap_or(0.0), below.formal_order.unwrap_or(0.0));
            let statement =
                format!("the order of the {} is {found:.1} in questions of every kind, not {claimed}", below.quantity);
            simple("order", statement, Certainty::Likely, of, of)
        }));
        return causes;
    }
    let is_first = |which: usize| order(right, which).map(|order| order < 1.5);
    if is_first(1) == Some(true) && [0, 2].iter().all(|which| is_first(*which) != Some(true)) {
        let statement = "the time alone has order 1: it is that of the end of a step";
        causes.push(cause("event-time-late", statement, Certainty::Likely, of));
        return causes;
    }
    // No scheme that is known: what do the questions of order one have in common?
    for (id, contents, statement) in [
        ("drag-lagged", &[Content::Drag, Content::Viscosity][..], "the order falls to 1 where the force depends on V"),
        (
            "force-stale",
            &[Content::Stiffness, Content::LaterStiffness][..],
            "the order falls to 1 where the force depends on x: its depth is that of another time",
        ),
        (
            "stage-end-late",
            &[Content::ForceJump][..],
            "the order falls to 1 where the force jumps at the end of a stage",
        ),
        ("stage-end-late", &[Content::StageEnd][..], "the order falls to 1 where the end of a stage is passed"),
        ("exit-late", &[Content::Exit][..], "the order falls to 1 at the exit"),
        ("rest-late", &[Content::Rest][..], "the order falls to 1 at rest: it is taken at a step"),
        (
            "start-kick",
            &[Content::StaticForce, Content::Drive, Content::Viscosity, Content::Drag][..],
            "the order falls to 1 where there is a force at impact: V half a step back is V0 itself",
        ),
    ] {
        if causes.len() == 2 || (id == "start-kick" && !causes.is_empty()) {
            break;
        }
        let holds = |question: &Question| question.contains.iter().any(|content| contents.contains(content));
        let part = |is_with: bool| -> Vec<(&Question, &[Rung])> {
            right.iter().copied().filter(|(question, _)| holds(question) == is_with).collect()
        };
        let lowest =
            |part: &[(&Question, &[Rung])]| (0..3).filter_map(|which| order(part, which)).fold(f64::INFINITY, f64::min);
        let (inside, outside) = (part(true), part(false));
        if !inside.is_empty() && !outside.is_empty() && lowest(&inside) < 1.5 && lowest(&outside) > 1.6 {
            causes.push(cause(id, statement, Certainty::Likely, inside.len()));
        }
    }
    causes.dedup_by(|a, b| a.id == b.id);
    if causes.is_empty() {
        let statement = "the order is about 1 in questions of every kind";
        causes.push(cause("first-order-scheme", statement, Certainty::Likely, of));
    }
    causes
}

#[cfg(test)]
mod tests;
