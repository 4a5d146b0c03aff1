//! Through which stages does a solver go wrong? Each stage is judged by itself, from the state that the solver lists at its start.
//!
//! The list of events cuts a flight into passages, one a stage; a solver without a list is asked for exits at the ends of stages. Where the formula of one kind of stage is wrong, or one below a
//! threshold, the wrong passages have something in common: the simplest [`Condition`], or pair of them, that holds for all of them
//! and for hardly any right one.

mod closed_forms;
mod terms;

use std::fmt::{self, Display, Formatter};

use super::super::causes::{Cause, Certainty};
use super::super::questions::{Content, Question, questions};
use super::super::{Asking, Diagnosis, QUANTITIES, TOLERANCES, end_of, request};
use crate::exchange::peers::wire::{conditioning, errors};
use crate::exchange::peers::{PeerAnswer, PeerRequest};
use crate::integrators::{Detail, Integrator, Taylor};
use crate::physics::{Concrete, CraterStiffness, Criterion, Event, EventKind, Outcome, Problem, Scene, Stage, State};
use crate::studies::verdict::Verdict;

/// Relative errors over the condition up to which a passage is right, and from which it is wrong: of a solver that takes a tolerance,
/// and of one of fixed steps.
const RIGHT_AND_WRONG: [[f64; 2]; 2] = [[3e-9, 1e-7], [5e-3, 0.03]];
/// Condition above which a passage tells nothing, and the least part of depth and time that one must take.
const CONDITION_MAX: f64 = 1e3;
const LEAST_PART: f64 = 1e-5;
/// Wrong passages, and right ones elsewhere, that a condition needs, and how often more questions are asked for them.
const ENOUGH: usize = 8;
const MORE: u64 = 4;
const MORE_FROM: u64 = 1_000_003;
/// Part of the passages under a condition that must be wrong, for it to be what is wrong and for it to be where; and of factors that
/// must be one.
const MOST: f64 = 0.8;
const SOME: f64 = 0.25;
/// Right passages elsewhere, over the wrong ones, that are far more.
const FAR_MORE: usize = 5;
/// The same for a size of stages to be what is wrong, and not their steps.
const FAR_MORE_THAN_OF_STEPS: usize = 10;
/// What a condition costs, without a number and with one, in parts of all right passages that it holds for.
const PRICE: f64 = 0.01;
const PRICE_OF_NUMBER: f64 = 0.04;
/// Part of the wrong passages in which a quantity must be wrong to be named, and part by which factors that are one differ.
const NAMED: f64 = 0.5;
const ONE_FACTOR: f64 = 1e-6;

/// How a passage ends.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Through,
    Exit,
    Rest,
}

/// The flight through one stage, from a state that a solver lists.
struct Passage<'a> {
    question: &'a Question,
    /// What a reader of scenes was asked.
    scene: Option<&'a Scene>,
    index: usize,
    mass: f64,
    law: Stage,
    from: State,
    /// The right end, its time since the start.
    end: State,
    way: Way,
    /// What is found, since the start.
    found: State,
    /// The stage by itself, its depth since the start.
    alone: Problem,
    /// Whether what is wrong with the flight is only supposed to be wrong in this stage.
    is_supposed: bool,
    /// Which of depth, time and velocity are wrong.
    wrong: [bool; 3],
    /// What is found of each over what is right.
    ratios: [f64; 3],
}

impl Passage<'_> {
    fn is_wrong(&self) -> bool {
        self.wrong.contains(&true)
    }

    /// Which of its terms the force has.
    fn terms(&self) -> [bool; 4] {
        terms(&self.law)
    }

    /// Those of the stage before.
    fn terms_before(&self) -> Option<[bool; 4]> {
        Some(terms(self.question.problem.stages.get(self.index.checked_sub(1)?)?))
    }

    fn concrete(&self) -> Option<&Concrete> {
        self.scene?.concrete()
    }

    /// A number of its concrete.
    fn of_concrete(&self, of: impl Fn(&Concrete) -> f64) -> f64 {
        self.concrete().map_or(f64::NAN, of)
    }

    fn distance(&self) -> f64 {
        self.end.depth - self.from.depth
    }

    /// Sizes of the force (N) at the start and at the end.
    fn forces(&self) -> [f64; 2] {
        [self.from, self.end].map(|at| self.law.force(at.depth, at.velocity).abs())
    }
}

/// Which terms the force of a stage has.
pub(super) fn terms(law: &Stage) -> [bool; 4] {
    [law.static_force, law.stiffness, law.viscosity, law.drag].map(|coefficient| coefficient != 0.0)
}

const TERMS: [&str; 4] = ["a static force", "a spring", "viscosity", "drag"];
/// The cause of each, and the term itself.
pub(super) const OF_TERM: [(&str, &str); 4] = [
    ("term:static-force", "the static force p"),
    ("term:stiffness", "the stiffness s"),
    ("term:viscosity", "the viscosity r"),
    ("term:drag", "the drag q"),
];

/// A number of a passage: what it is, its unit, and itself.
type Number = (&'static str, &'static str, fn(&Passage<'_>) -> f64);

static NUMBERS: [Number; 28] = [
    ("the smaller force at its ends", " N", |at| at.forces()[0].min(at.forces()[1])),
    ("the greater force at its ends", " N", |at| at.forces()[0].max(at.forces()[1])),
    ("V at its start", " m/s", |at| at.from.velocity),
    ("V at its end", " m/s", |at| at.end.velocity),
    ("V at its end over that at its start", "", |at| at.end.velocity / at.from.velocity),
    ("its distance", " m", |at| at.distance()),
    ("its time", " s", |at| at.end.time),
    ("the depth at its start", " m", |at| at.from.depth),
    ("the depth at its end", " m", |at| at.end.depth),
    ("the mass", " kg", |at| at.mass),
    ("the size of p", " N", |at| at.law.static_force.abs()),
    ("the size of s", " N/m", |at| at.law.stiffness.abs()),
    ("r", " kg/s", |at| at.law.viscosity),
    ("q", " kg/m", |at| at.law.drag),
    ("q V²/p at its start", "", |at| at.law.drag * at.from.velocity.powi(2) / at.law.static_force.abs()),
    ("q L/M", "", |at| at.law.drag * at.distance() / at.mass),
    ("r L/(M V) at its start", "", |at| at.law.viscosity * at.distance() / (at.mass * at.from.velocity)),
    ("s L²/(M V²) at its start", "", |at| {
        at.law.stiffness.abs() * at.distance().powi(2) / (at.mass * at.from.velocity.powi(2))
    }),
    ("r²/(4 s M)", "", |at| at.law.viscosity.powi(2) / (4.0 * at.law.stiffness.abs() * at.mass)),
    ("4 s M - r²", " kg²/s²", |at| 4.0 * at.law.stiffness * at.mass - at.law.viscosity.powi(2)),
    ("its share of the time so far", "", |at| at.end.time / (at.from.time + at.end.time)),
    ("the diameter", " m", |at| at.of_concrete(|concrete| concrete.diameter)),
    ("the strength", " Pa", |at| at.of_concrete(|concrete| concrete.strength)),
    ("the density", " kg/m³", |at| at.of_concrete(|concrete| concrete.density)),
    ("the nose factor", "", |at| at.of_concrete(|concrete| concrete.nose_factor)),
    ("S", "", |at| at.of_concrete(|concrete| concrete.static_factor)),
    ("k", "", |at| at.of_concrete(|concrete| concrete.crater_ratio)),
    ("H/d", "", |at| {
        let thickness = at.scene.and_then(|scene| scene.thickness);
        at.of_concrete(|concrete| thickness.unwrap_or(f64::NAN) / concrete.diameter)
    }),
];

/// What a physical scene states, or not: in words, and itself.
type Statement = ([&'static str; 2], fn(&Scene, &Concrete) -> bool);

static STATEMENTS: [Statement; 3] = [
    (["the criterion is `ndrc`", "the exit is the far side"], |scene, _| scene.criterion == Criterion::Ndrc),
    (["S follows from the strength", "S is stated"], |_, concrete| concrete.follows_eq14),
    (["c follows from the other numbers", "c is stated"], |_, concrete| {
        concrete.crater_stiffness == CraterStiffness::Continuous
    }),
];

/// What a passage may have.
#[derive(Clone, Copy)]
enum Condition {
    /// A term, or not.
    Term(usize, bool),
    /// These terms and no other.
    Alone([bool; 4]),
    /// A term of the stage before, or not.
    TermBefore(usize, bool),
    /// What the scene states, or not.
    States(&'static Statement, bool),
    Ends(Way),
    /// It ends at its end, or at the exit.
    Left,
    First(bool),
    /// A number that is smaller, or greater, than all between two bounds.
    Below(&'static Number, [f64; 2]),
    Above(&'static Number, [f64; 2]),
}

impl Condition {
    fn holds(&self, passage: &Passage<'_>) -> bool {
        match *self {
            Self::Term(term, has) => passage.terms()[term] == has,
            Self::Alone(terms) => passage.terms() == terms,
            Self::TermBefore(term, has) => passage.terms_before().is_some_and(|terms| terms[term] == has),
            Self::States((_, holds), has) => {
                let scene = passage.scene.zip(passage.concrete());
                scene.is_some_and(|(scene, concrete)| holds(scene, concrete) == has)
            }
            Self::Ends(way) => passage.way == way,
            Self::Left => passage.way != Way::Rest,
            Self::First(is_first) => (passage.index == 0) == is_first,
            Self::Below((_, _, of), [bound, _]) => of(passage) <= bound,
            Self::Above((_, _, of), [_, bound]) => of(passage) >= bound,
        }
    }

    fn has_number(&self) -> bool {
        matches!(self, Self::Below(..) | Self::Above(..))
    }

    fn price(&self) -> f64 {
        if self.has_number() { PRICE_OF_NUMBER } else { PRICE }
    }

    /// Whether the ends of all flights may have it.
    fn is_of_an_end(&self) -> bool {
        matches!(self, Self::Ends(Way::Exit | Way::Rest) | Self::Left | Self::First(true))
    }

    /// All without a number.
    fn plain() -> impl Iterator<Item = Self> {
        let both = [true, false];
        let terms = (0..TERMS.len()).flat_map(move |term| both.map(|has| Self::Term(term, has)));
        let before = (0..TERMS.len()).flat_map(move |term| both.map(|has| Self::TermBefore(term, has)));
        let stated = STATEMENTS.iter().flat_map(move |of| both.map(|has| Self::States(of, has)));
        let ways = [Way::Through, Way::Exit, Way::Rest].map(Self::Ends);
        let alone = (0..16_u8).map(|bits| Self::Alone([1, 2, 4, 8].map(|bit| bits & bit > 0)));
        let plain = terms.chain(ways).chain([Self::Left]).chain(both.map(Self::First));
        plain.chain(alone).chain(before).chain(stated)
    }

    /// All with a number that hold for all of `wrong` and for the fewest of `right`.
    fn of_numbers(wrong: &[&Passage<'_>], right: &[&Passage<'_>]) -> Vec<Self> {
        let mut found = Vec::new();
        for number in &NUMBERS {
            let of = number.2;
            let [least, most] = wrong.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], passage| {
                let value = of(passage);
                // What is no number has neither a least nor a greatest.
                if value.is_nan() { [f64::NAN; 2] } else { [least.min(value), most.max(value)] }
            });
            // One that a term makes infinite is that term.
            if !(least.is_finite() && most.is_finite()) {
                continue;
            }
            let beside = || right.iter().map(|passage| of(passage));
            let next = beside().filter(|value| *value > most).fold(f64::INFINITY, f64::min);
            let before = beside().filter(|value| *value < least).fold(f64::NEG_INFINITY, f64::max);
            if most < next && next.is_finite() {
                found.push(Self::Below(number, [most, next]));
            }
            if before < least && before.is_finite() {
                found.push(Self::Above(number, [before, least]));
            }
        }
        found
    }
}

impl Display for Condition {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Term(term, true) => write!(f, "it has {}", TERMS[term]),
            Self::Term(term, false) => write!(f, "it is without {}", TERMS[term]),
            Self::Alone([false, false, false, false]) => write!(f, "it has no force"),
            Self::Alone(terms) => {
                let named: Vec<&str> = TERMS.into_iter().zip(terms).filter(|(_, has)| *has).map(|(of, _)| of).collect();
                write!(f, "it has {} alone", named.join(" and "))
            }
            Self::TermBefore(term, true) => write!(f, "the stage before has {}", TERMS[term]),
            Self::TermBefore(term, false) => write!(f, "the stage before is without {}", TERMS[term]),
            Self::States(([holds, _], _), true) => f.write_str(holds),
            Self::States(([_, not], _), false) => f.write_str(not),
            Self::Ends(Way::Through) => write!(f, "it is passed to its end"),
            Self::Ends(Way::Exit) => write!(f, "it ends at the exit"),
            Self::Ends(Way::Rest) => write!(f, "the flight comes to rest in it"),
            Self::Left => write!(f, "the flight leaves it"),
            Self::First(true) => write!(f, "it is the first"),
            Self::First(false) => write!(f, "it is not the first"),
            Self::Below((what, unit, _), [from, to]) => {
                write!(f, "{what} is below a number from {from:.3e} to {to:.3e}{unit}")
            }
            Self::Above((what, unit, _), [from, to]) => {
                write!(f, "{what} is above a number from {from:.3e} to {to:.3e}{unit}")
            }
        }
    }
}

/// What wrong passages have in common.
pub(super) struct ByStages {
    pub cause: Cause,
    /// Whether it is a kind of stage, not a number or the event at which the flight ends.
    pub is_of_kinds: bool,
    /// Whether far more passages elsewhere are right.
    pub is_told_apart: bool,
    /// Questions that show it, those asked for it among them.
    pub shown_by: usize,
}

/// What the wrong passages of failing flights have in common.
pub(super) fn measured(asking: &mut Asking<'_>, all: &[Question], found: &Diagnosis) -> Option<ByStages> {
    let is_open = |question: &Question| {
        let never = [Content::NoSpeed, Content::Grazing, Content::Stiff];
        !never.iter().any(|content| question.contains.contains(content)) && !question.is_on_a_border()
    };
    let (mut passages, mut supposed, mut unlisted) = (Vec::new(), Vec::new(), Vec::new());
    let mut failing = Vec::new();
    let bounds = RIGHT_AND_WRONG[usize::from(found.peer.fixed_step)];
    for row in &found.questions {
        let Some(question) = all.iter().find(|question| question.id == row.id) else { continue };
        if row.answered.is_none() || !is_open(question) || asking.is_gone {
            continue;
        }
        if row.verdict == Verdict::Failed {
            failing.push(question);
        }
        let asked = PeerRequest { dt_s: row.dt_s, ..request(question, TOLERANCES[TOLERANCES.len() - 1]) };
        let Ok((answer, through)) = with_ends(asking, question, &asked) else { continue };
        passages.extend(passages_of(question, asking.reads_scene, (&answer, through), bounds));
        let (late, right): (Vec<_>, Vec<_>) = unlisted_passages_of(question, asking.reads_scene, &answer, bounds)
            .into_iter()
            .partition(|passage| passage.is_supposed);
        unlisted.extend(right);
        supposed.extend(late);
    }
    let count = |passages: &[Passage<'_>]| passages.iter().filter(|passage| passage.is_wrong()).count();
    let more: Vec<Vec<Question>> = if found.peer.fixed_step || count(&passages) >= ENOUGH {
        Vec::new()
    } else {
        (0..MORE).map(|seed| questions(MORE_FROM + seed, found.counts.asked, asking.reads_scene)).collect()
    };
    for question in more.iter().flatten().filter(|question| is_open(question)) {
        if asking.is_gone || count(&passages) >= ENOUGH {
            break;
        }
        let asked = request(question, TOLERANCES[TOLERANCES.len() - 1]);
        let Ok((answer, through)) = with_ends(asking, question, &asked) else { continue };
        passages.extend(passages_of(question, asking.reads_scene, (&answer, through), bounds));
    }
    let (wrong, right): (Vec<&Passage<'_>>, Vec<&Passage<'_>>) =
        passages.iter().partition(|passage| passage.is_wrong());
    let all_right: Vec<&Passage<'_>> = right.iter().copied().chain(&unlisted).collect();
    let supposed: Vec<&Passage<'_>> = supposed.iter().collect();
    let slip = of_slip(&wrong, &all_right, &failing, found).or_else(|| of_slip(&supposed, &all_right, &failing, found));
    if slip.is_some() {
        return slip;
    }
    let what_is_wrong = simplest(&wrong, &right, MOST);
    if let Some(of_term) = of_term(&wrong, what_is_wrong.as_deref(), &failing, found) {
        return Some(of_term);
    }
    let is_what = what_is_wrong.is_some();
    let conditions = what_is_wrong.or_else(|| simplest(&wrong, &right, SOME))?;
    let of_condition = |passages: &[&Passage<'_>]| {
        passages.iter().filter(|passage| conditions.iter().all(|condition| condition.holds(passage))).count()
    };
    let (inside, elsewhere) = (wrong.len() + of_condition(&right), right.len() - of_condition(&right));
    let is_often = |which: &usize| {
        wrong.iter().filter(|passage| passage.wrong[*which]).count() as f64 >= NAMED * wrong.len() as f64
    };
    let often: Vec<usize> = (0..3).filter(is_often).collect();
    let quantities: Vec<&str> = often.iter().map(|which| QUANTITIES[*which]).collect();
    let what = if let [one] = quantities[..] { format!("{one} alone") } else { quantities.join(" and ") };
    // One that leaves the stage in place of coming to rest has another.
    let alike = wrong.iter().filter(|passage| (0..3).filter(|which| passage.wrong[*which]).eq(often.iter().copied()));
    let factor = if let [which] = often[..] { one_factor(alike.map(|passage| passage.ratios[which])) } else { None };
    let times = factor.map_or_else(String::new, |factor| format!(", {factor:.6} times the right one,"));
    let said: Vec<String> = conditions.iter().map(ToString::to_string).collect();
    let statement = format!(
        "the flight through a stage, from the solver's state at its start, has a wrong {what}{times} {} {}: {} of {inside} such \
         passages, and none of the {elsewhere} others",
        if is_what { "where" } else { "in part of those where" },
        said.join(" and "),
        wrong.len()
    );
    let explained = explained_of(&failing, &wrong);
    // A flight that fails, and each stage of which is right.
    let is_right = |question: &&&Question| {
        let judged: Vec<&Passage<'_>> = passages.iter().filter(|passage| is_of(question, passage)).collect();
        let ends = judged.last().is_some_and(|last| last.way != Way::Through && last.index + 1 == judged.len());
        ends && judged.iter().all(|passage| !passage.is_wrong())
    };
    let right_in_parts = failing.iter().filter(is_right).count();
    // Of no kind of stage, and whatever the number: where steps end elsewhere, they are right.
    let located =
        if let [Condition::Left] = conditions[..] { ": its end is not located as accurately as rest is" } else { "" };
    let statement = statement + located;
    // A number that tells few right passages from the wrong ones does so by chance.
    let has_number = conditions.iter().any(Condition::has_number);
    let is_where = 10 * right_in_parts <= failing.len() && !(has_number && elsewhere < FAR_MORE * wrong.len());
    let explains_most = 10 * explained >= 9 * failing.len();
    let certainty = if is_what && (explains_most || is_where) { Certainty::Likely } else { Certainty::Possible };
    let cause = Cause::plain("stage-wrong", statement, certainty, explained, found.counts.failed);
    let is_of_kinds = !has_number && !conditions.iter().all(Condition::is_of_an_end);
    // Passages of one question follow each other.
    let shown_by = wrong.chunk_by(|one, next| std::ptr::eq(one.question, next.question)).count();
    let is_told_apart = elsewhere >= FAR_MORE_THAN_OF_STEPS * wrong.len();
    Some(ByStages { cause: Cause { factor, ..cause }, is_of_kinds, is_told_apart, shown_by })
}

fn is_of(question: &Question, passage: &Passage<'_>) -> bool {
    std::ptr::eq(passage.question, question)
}

/// How many of `failing` have a wrong passage.
fn explained_of(failing: &[&Question], wrong: &[&Passage<'_>]) -> usize {
    failing.iter().filter(|question| wrong.iter().any(|passage| is_of(question, passage))).count()
}

/// The slip in a closed form that explains the wrong passages.
fn of_slip(
    wrong: &[&Passage<'_>],
    right: &[&Passage<'_>],
    failing: &[&Question],
    found: &Diagnosis,
) -> Option<ByStages> {
    let slip = closed_forms::explained(wrong, right).filter(|slip| 2 * slip.count >= slip.of)?;
    let closed_forms::Explained { statement, count, of } = slip;
    let statement = format!("{statement}: {count} of {of} wrong passages");
    let explained = explained_of(failing, wrong);
    let cause = Cause::plain("closed-form", statement, Certainty::Likely, explained, found.counts.failed);
    Some(ByStages { cause, is_of_kinds: true, is_told_apart: true, shown_by: wrong.len() })
}

/// The term of the force whose factor explains wrong passages.
fn of_term(
    wrong: &[&Passage<'_>],
    conditions: Option<&[Condition]>,
    failing: &[&Question],
    found: &Diagnosis,
) -> Option<ByStages> {
    let terms::Factored { term, factor, count } = terms::factored(wrong)?;
    let said: Vec<String> = conditions.unwrap_or_default().iter().map(ToString::to_string).collect();
    let place = if said.is_empty() { String::new() } else { format!(" where {}", said.join(" and ")) };
    let (id, what) = OF_TERM[term];
    let changed = if factor == 0.0 { format!("without {what}") } else { format!("with {factor:.6} times {what}") };
    let statement = format!(
        "the flight through a stage, from the solver's state at its start, is that {changed}{place}: {count} of {} wrong passages",
        wrong.len()
    );
    let explained = explained_of(failing, wrong);
    let certainty = if 2 * count >= wrong.len() { Certainty::Likely } else { Certainty::Possible };
    let cause = Cause::plain(id, statement, certainty, explained, found.counts.failed);
    let cause = Cause { factor: Some(factor), ..cause };
    Some(ByStages { cause, is_of_kinds: true, is_told_apart: true, shown_by: wrong.len() })
}

/// The factor that most of `ratios` are.
fn one_factor(ratios: impl Iterator<Item = f64>) -> Option<f64> {
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_by(f64::total_cmp);
    let middle = *ratios.get(ratios.len() / 2)?;
    let same = ratios.iter().filter(|ratio| (*ratio - middle).abs() <= ONE_FACTOR * middle.abs()).count();
    (same as f64 >= MOST * ratios.len() as f64).then_some(middle)
}

/// The answer to `asked`, and how the flight goes through its stages: where it lists no events, their ends are asked for as exits.
fn with_ends(asking: &mut Asking<'_>, question: &Question, asked: &PeerRequest) -> Result<(PeerAnswer, Way), String> {
    let mut answer = asking.ask(asked)?;
    if asking.reads_scene || !answer.events.is_empty() {
        return Ok((answer, Way::Through));
    }
    let problem = &question.problem;
    let end_of_flight = answer.depth_m.min(problem.exit_depth);
    for (index, law) in problem.stages.iter().enumerate().take_while(|(_, law)| law.end < end_of_flight) {
        let up_to = problem.clone().with_exit(law.end);
        let request = PeerRequest { dt_s: asked.dt_s, ..PeerRequest::from_problem(&up_to, asked.rtol) };
        // What came so far tells of its stages.
        let Ok(there) = asking.ask(&request) else { break };
        let state = end_of(&there).state;
        answer.events.push(Event { kind: EventKind::StageEnd(index), state });
    }
    Ok((answer, Way::Exit))
}

/// The passages of an `answer` to `problem` of which it is plain whether they are right; `through` is how it goes through a stage.
fn passages_of<'a>(
    question: &'a Question,
    reads_scene: bool,
    (answer, through): (&PeerAnswer, Way),
    bounds: [f64; 2],
) -> Vec<Passage<'a>> {
    let mut passages = Vec::new();
    let problem = &question.problem;
    let scene = question.scene.as_ref().filter(|_| reads_scene);
    let last = end_of(answer).state;
    let mut from = State { time: 0.0, depth: 0.0, velocity: problem.impact_speed };
    for (index, law) in problem.stages.iter().enumerate() {
        let is_listed =
            |kind: EventKind| kind == EventKind::StageEnd(index) || index == 0 && kind == EventKind::CraterEnd;
        let boundary = law.end.min(problem.exit_depth);
        let listed = answer.events.iter().find(|event| is_listed(event.kind)).map(|event| event.state);
        let listed = listed.filter(|_| law.end < problem.exit_depth);
        if listed.is_none() && last.depth > law.end || !(from.velocity > 0.0) {
            break;
        }
        let found = listed.unwrap_or(last);
        let judged = judged(question, index, [from, found], boundary, bounds);
        let way = |passage: &Passage<'_>| if passage.way == Way::Through { through } else { passage.way };
        passages.extend(judged.map(|passage| Passage { scene, way: way(&passage), ..passage }));
        if listed.is_none() {
            break;
        }
        from = found;
    }
    passages
}

/// The passages of a flight through several stages of which no events are listed: right ones, where all of it is right; where its time
/// alone is wrong, each as if that were so in its stage; else the last, as if the others were right.
fn unlisted_passages_of<'a>(
    question: &'a Question,
    reads_scene: bool,
    answer: &PeerAnswer,
    bounds: [f64; 2],
) -> Vec<Passage<'a>> {
    let (problem, exact, found) = (&question.problem, question.exact.end, end_of(answer).state);
    let off = errors(found, exact, problem.impact_speed);
    let [is_same_depth, is_on_time, is_same_velocity] =
        std::array::from_fn(|which| off[which].abs() <= bounds[0] * question.conditions[which]);
    let flight = Taylor::default().solve(problem, Detail::Events).ok().filter(|flight| flight.stage > 0);
    let Some(flight) = flight.filter(|_| answer.events.is_empty()) else { return Vec::new() };
    let is_same_path = is_same_depth && is_same_velocity;
    let is_right = is_same_path && is_on_time;
    let late = if is_on_time { 0.0 } else { found.time - exact.time };
    let scene = question.scene.as_ref().filter(|_| reads_scene);
    let mut from = State::at_impact(problem);
    let passages = (0..=flight.stage).filter_map(|index| {
        let is_last = index == flight.stage;
        let to = flight.events.get(index).filter(|_| !is_last).map_or(flight.end, |event| event.state);
        let boundary = problem.stages[index].end.min(problem.exit_depth);
        let as_found = if is_same_path { State { time: to.time + late, ..to } } else { found };
        let start = std::mem::replace(&mut from, to);
        if !(is_same_path || is_last) {
            return None;
        }
        let judged = judged(question, index, [start, as_found], boundary, bounds)?;
        (judged.is_wrong() != is_right).then_some(Passage { scene, is_supposed: !is_right, ..judged })
    });
    passages.collect()
}

/// The passage through stage `index` of `problem` from one state to another; `None` where it is not plain whether it is right.
fn judged(
    question: &Question,
    index: usize,
    [from, found]: [State; 2],
    boundary: f64,
    [right, wrong]: [f64; 2],
) -> Option<Passage<'_>> {
    let problem = &question.problem;
    let law = problem.stages[index];
    let shifted = Stage { static_force: law.static_force + law.stiffness * from.depth, end: f64::INFINITY, ..law };
    let alone = Problem::of_stages(problem.mass, from.velocity, [shifted]);
    let alone = if boundary.is_finite() { alone.with_exit(boundary - from.depth) } else { alone };
    if !(boundary > from.depth) {
        return None;
    }
    let exact = Taylor::default().solve(&alone, Detail::End).ok()?;
    let conditions = conditioning(exact.end, &alone);
    let is_seen = exact.end.depth >= LEAST_PART * from.depth && exact.end.time >= LEAST_PART * from.time;
    if !is_seen || conditions.iter().any(|condition| *condition > CONDITION_MAX) {
        return None;
    }
    let way = match exact.outcome {
        Outcome::Perforated if law.end < problem.exit_depth => Way::Through,
        Outcome::Perforated => Way::Exit,
        _ => Way::Rest,
    };
    let passed = State { time: found.time - from.time, depth: found.depth - from.depth, velocity: found.velocity };
    let off = errors(passed, exact.end, from.velocity);
    let over: [f64; 3] = std::array::from_fn(|which| off[which].abs() / conditions[which]);
    if over.iter().any(|over| *over > right && !(*over > wrong)) {
        return None;
    }
    let end = State { depth: from.depth + exact.end.depth, ..exact.end };
    let wrong = over.map(|over| !(over <= right));
    let of = |state: State| [state.depth, state.time, state.velocity];
    let ratios = std::array::from_fn(|which| of(passed)[which] / of(exact.end)[which]);
    let (mass, found) = (problem.mass, passed);
    Some(Passage {
        question,
        scene: None,
        index,
        mass,
        law,
        from,
        end,
        way,
        found,
        alone,
        is_supposed: false,
        wrong,
        ratios,
    })
}

/// The conditions that hold for all of `wrong` and cost least, where this `part` of the passages that they hold for is wrong.
fn simplest(wrong: &[&Passage<'_>], right: &[&Passage<'_>], part: f64) -> Option<Vec<Condition>> {
    if wrong.len() < ENOUGH || right.len() < ENOUGH {
        return None;
    }
    let of_all = |condition: &Condition| wrong.iter().all(|passage| condition.holds(passage));
    let plain: Vec<Condition> = Condition::plain().filter(of_all).collect();
    let alone = plain.iter().map(|one| vec![*one]);
    let pairs = (0..plain.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| vec![plain[j], plain[i]]);
    let mut best: Option<(f64, Vec<Condition>)> = None;
    for kinds in std::iter::once(Vec::new()).chain(alone).chain(pairs) {
        let inside: Vec<&Passage<'_>> =
            right.iter().copied().filter(|passage| kinds.iter().all(|kind| kind.holds(passage))).collect();
        // A number is no place, where much of what lies on its side is right.
        let numbers = if part < MOST { Vec::new() } else { Condition::of_numbers(wrong, &inside) };
        let numbers = numbers.into_iter().map(Some);
        for number in std::iter::once(None).chain(numbers) {
            let left = inside.iter().filter(|passage| number.is_none_or(|number| number.holds(passage))).count();
            let conditions: Vec<Condition> = kinds.iter().copied().chain(number).collect();
            let is_shown = wrong.len() as f64 >= part * (wrong.len() + left) as f64 && right.len() - left >= ENOUGH;
            let price: f64 = conditions.iter().map(Condition::price).sum();
            let cost = left as f64 + price * right.len() as f64;
            if is_shown && best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, conditions));
            }
        }
    }
    best.map(|(_, conditions)| conditions)
}
