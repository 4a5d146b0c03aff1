//! What a solver is asked: random problems that together hold every term in every stage and every kind of event.

use serde::Serialize;

use super::hypotheses::Predictions;
use crate::exchange::peers::wire::PeerScene;
use crate::integrators::Flight;
use crate::physics::{CraterStiffness, Criterion, Outcome, Problem, Resistance, Scene, Stage, State};
use crate::studies::edge_problems::{Case, cases};
use crate::studies::error::{Truth, conditions_in_dual_numbers};
use crate::studies::random::Random;
use crate::studies::random_problems::{Kind, Scale};
use crate::studies::random_scenes::Generator;

/// Largest condition number of a question: beyond it a sound solver may err by more than its tolerance can tell.
const CONDITION_MAX: f64 = 1e3;
/// Largest condition number where the exit is grazed.
const CONDITION_AT_GRAZING: f64 = 1e10;
/// Distance from the end of a stage, relative to the depth, within which a flight ends on its border.
const BORDER: f64 = 1e-7;
/// Draws for one question at most.
const DRAWS_MAX: usize = 200;
/// Relative distance from rest within which an exit is grazed.
const GRAZING: f64 = 0.02;
/// Part of the greatest term of a stage below which another is weak.
const WEAK: f64 = 3e-3;
/// Part of the depth of the flight below which a stage is short.
const SHORT: f64 = 1e-2;
/// Fast rate of a stage, times the duration of the flight, from which it is stiff.
const STIFF: f64 = 200.0;
/// Velocity over the impact speed from which an exit is faster.
const FASTER: f64 = 1.05;
/// Relative jump of the force at the end of a stage that counts as one.
const JUMP: f64 = 1e-6;

/// What the flight of a question meets.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, strum::Display, strum::EnumIter, strum::IntoStaticStr,
)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Content {
    /// A static force that resists.
    StaticForce,
    /// A static force that drives.
    Drive,
    /// A spring in the first stage.
    Stiffness,
    /// A spring in a later stage.
    LaterStiffness,
    /// A force that falls with the depth, as a piece of a table may.
    Softening,
    /// A force proportional to V.
    Viscosity,
    /// A force proportional to V².
    Drag,
    /// A term that is next to nothing beside another of its stage.
    WeakTerm,
    /// A stage without force.
    AirGap,
    /// The end of a stage.
    StageEnd,
    /// Ends of two stages or more.
    SeveralStageEnds,
    /// A jump of the force at the end of a stage.
    ForceJump,
    /// A stage much shorter than the flight.
    ShortStage,
    /// A drive against viscosity with rates far apart.
    Stiff,
    /// The exit.
    Exit,
    /// The exit, before the last stage.
    ExitBeforeLastStage,
    /// The exit, at the very end of a stage.
    ExitAtStageEnd,
    /// The exit, faster than the impact.
    FasterExit,
    /// Rest.
    Rest,
    /// Rest just before the exit, or hardly any speed left there.
    Grazing,
    /// No impact speed.
    NoSpeed,
    /// A physical scene.
    Scene,
    /// A scene that states its crater stiffness.
    CraterStiffness,
    /// A scene that leaves S to Eq. 14.
    Eq14,
}

/// A problem that a solver is asked.
#[derive(Debug)]
pub(super) struct Question {
    /// Name: what kind, and which.
    pub id: String,
    /// The problem.
    pub problem: Problem,
    /// The physical scene it stems from.
    pub scene: Option<Scene>,
    /// The right answer.
    pub exact: Flight,
    /// What its flight meets, in the order of the list.
    pub contains: Vec<Content>,
    /// Condition numbers of depth, time and velocity at the end, at least one.
    pub conditions: [f64; 3],
    /// What was asked before it.
    pub earlier: Option<Earlier>,
    /// What single faults make of it.
    pub predicted: Predictions,
}

/// Questions asked earlier, whose numbers a solver may have kept.
#[derive(Clone, Debug)]
pub(super) struct Earlier {
    /// The first.
    pub first: Problem,
    /// The one before.
    pub previous: Problem,
    /// The last exit depth (m) that was asked.
    pub exit: f64,
}

/// What alone differs between a question and the one before it.
#[derive(Clone, Copy, Debug)]
enum Input {
    /// The exit depth or the impact speed.
    Impact,
    /// The mass.
    Mass,
    /// The forces, or the density of the concrete.
    Target,
    /// The end of the first stage, or the thickness.
    Ends,
}

/// Tells each of `questions` what is asked before it.
pub(super) fn in_order(questions: &mut [Question]) {
    let Some(first) = questions.first().map(|first| first.problem.clone()) else { return };
    let (mut previous, mut exit) = (first.clone(), f64::INFINITY);
    for question in questions {
        question.earlier = Some(Earlier { first: first.clone(), previous: previous.clone(), exit });
        previous = question.problem.clone();
        if previous.has_exit() {
            exit = previous.exit_depth;
        }
    }
}

impl Question {
    /// The question about `problem`, unless it has no answer or too large a condition.
    fn new(id: String, problem: Problem, scene: Option<Scene>) -> Option<Self> {
        let exact = Truth::of(&problem).ok()?.flight;
        let contains = contents(&problem, scene.as_ref(), &exact);
        let allowed = if contains.contains(&Content::Grazing) { CONDITION_AT_GRAZING } else { CONDITION_MAX };
        let conditions = if problem.impact_speed > 0.0 {
            let all = conditions_in_dual_numbers(&problem).ok()?;
            [all[0], all[1], all[2]].map(|condition| condition.max(1.0))
        } else {
            [1.0; 3]
        };
        let is_usable = exact.outcome != Outcome::Undecided && conditions.iter().all(|condition| *condition <= allowed);
        let predicted = Predictions::default();
        is_usable.then_some(Self { id, problem, scene, exact, contains, conditions, earlier: None, predicted })
    }

    /// The same question with one of its inputs next to its own.
    fn again(&self, input: Input) -> Option<Self> {
        let (mut problem, mut scene) = (self.problem.clone(), self.scene.clone());
        if let Some(scene) = &mut scene {
            let concrete = match &mut scene.resistance {
                Resistance::Concrete(concrete) => Some(concrete),
                Resistance::Stages(_) => None,
            };
            match input {
                Input::Mass => scene.mass *= NEXT_TO,
                Input::Target => concrete?.density *= NEXT_TO,
                Input::Ends if scene.thickness.is_some() => scene.thickness = scene.thickness.map(|far| far * NEXT_TO),
                Input::Impact | Input::Ends => scene.velocity = scene.velocity.map(|velocity| velocity * NEXT_TO),
            }
            problem = scene.problem().ok()?;
        } else {
            let is_through = self.exact.outcome == Outcome::Perforated;
            match input {
                Input::Mass => problem.mass *= NEXT_TO,
                Input::Target => {
                    for law in &mut problem.stages {
                        let Stage { static_force, stiffness, viscosity, drag, .. } = law;
                        for term in [static_force, stiffness, viscosity, drag] {
                            *term *= NEXT_TO;
                        }
                    }
                }
                Input::Ends if problem.stages[0].end < problem.exit_depth => problem.stages[0].end /= NEXT_TO,
                Input::Impact | Input::Ends if is_through => problem.exit_depth *= NEXT_TO,
                Input::Impact | Input::Ends => problem.impact_speed *= NEXT_TO,
            }
        }
        Self::new(format!("{}-again", self.id), problem, scene)
    }

    /// The largest of the errors of depth, time and velocity over their condition numbers.
    pub(super) fn over_condition(&self, errors: [f64; 3]) -> f64 {
        (0..3).map(|i| errors[i].abs() / self.conditions[i]).fold(0.0, f64::max)
    }

    /// Whether the flight ends so near the end of a stage that a fault there decides it by round-off.
    pub(super) fn is_on_a_border(&self) -> bool {
        let State { depth, velocity, .. } = self.exact.end;
        let rests = velocity <= 0.0;
        // An exit at the very end of a stage is none.
        let is_near = |end: f64| (rests || end != depth) && (end - depth).abs() <= BORDER * depth;
        self.problem.stages.iter().any(|law| is_near(law.end))
    }

    /// The scene as a peer gets it.
    pub(super) fn peer_scene(&self) -> Option<PeerScene> {
        self.scene.as_ref().and_then(PeerScene::of)
    }
}

impl Content {
    /// What a force is made of.
    pub const TERMS: [Self; 13] = [
        Self::StaticForce,
        Self::Drive,
        Self::Stiffness,
        Self::LaterStiffness,
        Self::Softening,
        Self::Viscosity,
        Self::Drag,
        Self::WeakTerm,
        Self::AirGap,
        Self::Stiff,
        Self::Scene,
        Self::CraterStiffness,
        Self::Eq14,
    ];

    /// What a flight meets.
    pub const EVENTS: [Self; 11] = [
        Self::StageEnd,
        Self::SeveralStageEnds,
        Self::ForceJump,
        Self::ShortStage,
        Self::Exit,
        Self::ExitBeforeLastStage,
        Self::ExitAtStageEnd,
        Self::FasterExit,
        Self::Rest,
        Self::Grazing,
        Self::NoSpeed,
    ];

    /// `static force`.
    pub fn words(self) -> String {
        match self {
            Self::Eq14 => "S of Eq. 14".to_owned(),
            Self::Drive => "driving force".to_owned(),
            Self::Stiff => "stiff drive".to_owned(),
            Self::Scene => "physical scene".to_owned(),
            _ => self.to_string().replace('-', " "),
        }
    }
}

/// What the flight `exact` through `problem`, the one of `scene` if it has one, meets.
pub fn contents(problem: &Problem, scene: Option<&Scene>, exact: &Flight) -> Vec<Content> {
    let met = &problem.stages[..=exact.stage];
    let ends: Vec<f64> = met[..exact.stage].iter().map(|law| law.end).collect();
    let in_any = |of: fn(&Stage) -> bool| met.iter().any(of);
    let is_through = exact.outcome == Outcome::Perforated;
    let jumps = ends.iter().enumerate().any(|(index, &end)| {
        let passed =
            exact.events.iter().find(|event| event.state.depth == end).map_or(0.0, |event| event.state.velocity);
        let [before, behind] = [index, index + 1].map(|stage| problem.stages[stage].force(end, passed));
        (before - behind).abs() > JUMP * before.abs().max(behind.abs())
    });
    let is_short = |index: usize| problem.limit_of(index) - problem.start_of(index) < SHORT * exact.end.depth;
    let concrete = scene.and_then(Scene::concrete);
    let spring = |law: &Stage| law.stiffness > 0.0;
    // Each at its greatest.
    let (depth, speed) = (exact.end.depth, problem.impact_speed);
    let is_weak = |law: &Stage| {
        let terms = [law.static_force, law.stiffness * depth, law.viscosity * speed, law.drag * speed * speed];
        let greatest = terms.iter().fold(0.0, |most, term| f64::max(most, term.abs()));
        terms.iter().any(|term| *term != 0.0 && term.abs() < WEAK * greatest)
    };
    let free = |law: &Stage| Stage { end: 0.0, ..*law } == Stage { end: 0.0, ..Stage::free() };
    [
        (in_any(|law| law.static_force > 0.0), Content::StaticForce),
        (in_any(|law| law.static_force < 0.0), Content::Drive),
        (spring(&met[0]), Content::Stiffness),
        (met[1..].iter().any(spring), Content::LaterStiffness),
        (in_any(|law| law.stiffness < 0.0), Content::Softening),
        (in_any(|law| law.viscosity > 0.0), Content::Viscosity),
        (in_any(|law| law.drag > 0.0), Content::Drag),
        (met.iter().any(is_weak), Content::WeakTerm),
        (met.iter().any(free), Content::AirGap),
        (!ends.is_empty(), Content::StageEnd),
        (ends.len() > 1, Content::SeveralStageEnds),
        (jumps, Content::ForceJump),
        ((0..met.len()).any(is_short), Content::ShortStage),
        (met.iter().any(|law| law.viscosity * exact.end.time > STIFF * problem.mass), Content::Stiff),
        (is_through, Content::Exit),
        (is_through && exact.stage + 1 < problem.stages.len(), Content::ExitBeforeLastStage),
        (is_through && problem.stages.iter().any(|law| law.end == problem.exit_depth), Content::ExitAtStageEnd),
        (is_through && exact.end.velocity > FASTER * problem.impact_speed, Content::FasterExit),
        (exact.end.velocity <= 0.0, Content::Rest),
        (exact.exit_margin.is_some_and(|margin| margin.abs() < GRAZING), Content::Grazing),
        (problem.impact_speed == 0.0, Content::NoSpeed),
        (concrete.is_some(), Content::Scene),
        (
            concrete.is_some_and(|concrete| matches!(concrete.crater_stiffness, CraterStiffness::Given(_))),
            Content::CraterStiffness,
        ),
        (concrete.is_some_and(|concrete| concrete.follows_eq14), Content::Eq14),
    ]
    .into_iter()
    .filter_map(|(is_met, content)| is_met.then_some(content))
    .collect()
}

/// A way to draw a problem.
struct Family {
    name: &'static str,
    /// The problem, by the number of the round from 0.
    draw: fn(&mut Random, usize) -> Option<Problem>,
}

/// One stage of shares of p, s, r and q, drawn where the share is 1; with an exit before rest, or not.
fn single(random: &mut Random, terms: [f64; 4]) -> Option<Problem> {
    let scale = Scale::draw(random);
    let law = scale.stage(terms.map(|term| term * random.log_uniform(0.2, 3.0)));
    let endless = Problem::of_stages(scale.mass, scale.speed, [law]);
    let rests = terms[0] > 0.0 || terms[1] > 0.0;
    if rests && random.chance(0.5) {
        return Some(endless);
    }
    let far = if rests { Truth::of(&endless).ok()?.flight.end.depth } else { scale.length };
    Some(endless.with_exit(far * random.uniform(0.2, 0.95)))
}

/// A static force and one other term, another in every second round. In one round it is next to nothing: digits cancel in many a
/// formula, and by more than the tightest tolerance allows. In the other it is small, and the projectile comes to rest: a series in
/// the place of a formula needs more than a term or two.
fn weak(random: &mut Random, round: usize) -> Option<Problem> {
    let mut terms = [1.0, 0.0, 0.0, 0.0];
    let term = &mut terms[1 + (round / 2 + 1) % 3];
    if round.is_multiple_of(2) {
        *term = random.log_uniform(1e-7, 1e-5);
        return single(random, terms);
    }
    *term = random.log_uniform(1e-2, 0.05);
    let scale = Scale::draw(random);
    Some(Problem::of_stages(scale.mass, scale.speed, [scale.stage(terms)]))
}

/// A problem of several stages whose laws hold every pair of terms in turn, ending where `exit` says.
fn layered(random: &mut Random, ends: usize, law: impl Fn(&mut Random, &Scale, usize) -> Stage) -> Problem {
    let scale = Scale::draw(random);
    layered_to(scale, random, ends, law)
}

/// The same of a `scale`.
fn layered_to(
    scale: Scale,
    random: &mut Random,
    ends: usize,
    law: impl Fn(&mut Random, &Scale, usize) -> Stage,
) -> Problem {
    let mut end = 0.0;
    let mut stages = Vec::new();
    for index in 0..=ends {
        end += scale.length * random.uniform(0.05, 0.2);
        let law = law(random, &scale, index);
        stages.push(if index < ends { law.until(end) } else { law });
    }
    Problem::of_stages(scale.mass, scale.speed, stages)
}

/// Shares of a law with two or three terms, one of them static.
fn mixed(random: &mut Random, scale: &Scale) -> Stage {
    let mut shares = [random.log_uniform(0.3, 2.0), 0.0, 0.0, 0.0];
    for share in &mut shares[1..] {
        *share = if random.chance(0.5) { random.log_uniform(0.3, 2.0) } else { 0.0 };
    }
    scale.stage(shares)
}

/// `problem` with an exit at the depth of its rest times `1 + off`.
fn near_rest(problem: Problem, off: f64) -> Option<Problem> {
    let rest = Truth::of(&problem).ok()?.flight.end.depth;
    Some(problem.with_exit(rest * (1.0 + off)))
}

/// An exit nearer than rest by a part of the depth, ten to the minus one of `powers`, or in three cases of ten farther.
fn grazing(random: &mut Random, powers: [f64; 2]) -> Option<Problem> {
    let terms = [1.0, f64::from(u8::from(random.chance(0.3))), 0.0, f64::from(u8::from(random.chance(0.6)))];
    let problem = Problem { exit_depth: f64::INFINITY, ..single(random, terms)? };
    let off = 10f64.powf(-random.uniform(powers[0], powers[1]));
    near_rest(problem, if random.chance(0.7) { -off } else { off })
}

/// A driven and overdamped stage behind one that resists: the fast rate is thousands of times the slow one.
fn stiff(random: &mut Random) -> Problem {
    let scale = Scale::draw(random);
    let (rate, end) = (random.log_uniform(1e3, 5e3), 0.1 * scale.length);
    // r/M is so many times V/L; the drive balances it at a speed of about V, and the spring at 3 L.
    let driven = scale.stage([-rate, rate / 3.0, rate, 0.0]);
    let first = scale.stage([random.uniform(0.1, 1.0), 0.0, 0.0, random.uniform(0.0, 1.0)]);
    let stages = if random.chance(0.5) { vec![driven] } else { vec![first.until(end), driven] };
    Problem::of_stages(scale.mass, scale.speed, stages).with_exit(scale.length * random.uniform(0.8, 2.0))
}

/// Bands of r²/(s M), of which 4 is the border between underdamped and overdamped: one for each stage of a problem.
const DAMPINGS: [[f64; 2]; 3] = [[0.3, 1.8], [2.2, 3.9], [4.1, 12.0]];

/// A spring and viscosity whose r²/(s M) lies in the band `index`, and every other time a static force.
fn damped(random: &mut Random, scale: &Scale, index: usize) -> Stage {
    let [low, high] = DAMPINGS[index % DAMPINGS.len()];
    let stiffness = random.log_uniform(0.3, 3.0);
    let viscosity = (stiffness * random.log_uniform(low, high)).sqrt();
    let static_force = if random.chance(0.5) { random.log_uniform(0.1, 0.5) } else { 0.0 };
    scale.stage([static_force, stiffness, viscosity, 0.0])
}

/// The families in the order in which they are asked: what tells causes apart first.
const FAMILIES: [Family; 31] = [
    Family { name: "static-force", draw: |random, _| single(random, [1.0, 0.0, 0.0, 0.0]) },
    Family { name: "spring", draw: |random, _| single(random, [0.0, 1.0, 0.0, 0.0]) },
    Family { name: "drag", draw: |random, _| single(random, [0.0, 0.0, 0.0, 1.0]) },
    Family { name: "viscosity", draw: |random, _| single(random, [0.0, 0.0, 1.0, 0.0]) },
    Family { name: "tunnel", draw: |random, _| Kind::Tunnel.draw(random) },
    Family {
        name: "layers",
        draw: |random, _| near_rest(layered(random, 2, |random, scale, _| mixed(random, scale)), 0.3),
    },
    Family {
        name: "later-spring",
        draw: |random, _| {
            let problem = layered(random, 1, |random, scale, index| {
                let p = random.log_uniform(0.2, 1.0);
                scale.stage([p, if index > 0 { random.log_uniform(0.5, 5.0) } else { 0.0 }, 0.0, 0.0])
            });
            let off = if random.chance(0.5) { 0.5 } else { -0.1 };
            near_rest(problem, off)
        },
    },
    Family {
        name: "exit-in-a-stage",
        draw: |random, _| {
            let problem = layered(random, 3, |random, scale, _| mixed(random, scale));
            let stage = random.below(3);
            let (from, to) = (problem.start_of(stage), problem.stages[stage].end);
            let exit = random.uniform(from + 0.1 * (to - from), to);
            Some(problem.with_exit(exit))
        },
    },
    Family { name: "four-terms", draw: |random, _| single(random, [1.0, 1.0, 1.0, 1.0]) },
    Family { name: "grazing", draw: |random, _| grazing(random, [2.0, 4.5]) },
    Family { name: "crater", draw: |random, _| Kind::Crater.draw(random) },
    Family {
        name: "air-gap",
        draw: |random, _| {
            let problem = layered(
                random,
                2,
                |random, scale, index| {
                    if index == 1 { Stage::free() } else { mixed(random, scale) }
                },
            );
            let off = if random.chance(0.5) { 0.2 } else { -0.02 };
            near_rest(problem, off)
        },
    },
    Family {
        name: "softening",
        // A piece of a table: the force falls with the depth and keeps its sign, one that slows or one that drives.
        draw: |random, _| {
            let soft = random.below(2);
            let problem = layered(random, 2, |random, scale, index| {
                if index != soft {
                    return mixed(random, scale);
                }
                let force = random.log_uniform(0.3, 2.0);
                let [static_force, most] = if random.chance(0.5) { [force, 2.4] } else { [-0.5 * force, 8.0] };
                scale.stage([static_force, -force * random.uniform(0.5, most), 0.0, 0.0])
            });
            near_rest(problem, if random.chance(0.5) { 0.3 } else { -0.2 })
        },
    },
    Family { name: "driven", draw: |random, _| Kind::Driven.draw(random) },
    Family {
        name: "driven-out",
        // Left faster than entered.
        draw: |random, _| {
            let scale = Scale::draw(random);
            let drive = random.uniform(0.5, 3.0);
            let drag = if random.chance(0.5) { 0.1 * drive } else { 0.0 };
            let law = scale.stage([-drive, 0.0, 0.0, drag]);
            let exit = scale.length * random.uniform(0.3, 1.0);
            Some(Problem::of_stages(scale.mass, scale.speed, [law]).with_exit(exit))
        },
    },
    Family { name: "stiff", draw: |random, _| Some(stiff(random)) },
    Family {
        name: "small-term",
        // Terms that are next to nothing beside another still count.
        draw: |random, _| {
            let great = if random.chance(0.5) { 0 } else { 1 + random.below(3) };
            let share = |term| if term == great { 1.0 } else { random.log_uniform(1e-5, 1e-3) };
            let terms = [0, 1, 2, 3].map(share);
            single(random, terms)
        },
    },
    Family {
        name: "exit-at-stage-end",
        draw: |random, _| {
            let problem = layered(random, 2, |random, scale, _| mixed(random, scale));
            let exit = problem.stages[random.below(2)].end;
            Some(problem.with_exit(exit))
        },
    },
    Family {
        name: "hardly-out",
        // What is left of V is less than thresholds of rest are, and still more than the tightest tolerance allows.
        draw: |random, _| grazing(random, [7.8, 8.6]),
    },
    Family { name: "weak-term", draw: weak },
    Family { name: "several", draw: |random, _| Kind::Several.draw(random) },
    Family { name: "spring-and-drag", draw: |random, _| Kind::SpringAndDrag.draw(random) },
    Family {
        name: "viscous",
        // A formula for a spring and viscosity has two forms, and a border between them: stages on both sides of it, and near.
        draw: |random, round| match round % 4 {
            1 => Kind::Viscous.draw(random),
            3 => Kind::ViscousSpring.draw(random),
            _ => {
                let problem = layered(random, 2, |random, scale, index| damped(random, scale, index + round));
                near_rest(problem, if random.chance(0.5) { 0.3 } else { -0.1 })
            }
        },
    },
    Family {
        name: "short-stages",
        draw: |random, _| {
            let mut problem = layered(random, 5, |random, scale, _| mixed(random, scale));
            // A few stages share what is next to nothing of the way.
            let (from, thin) = (problem.stages[1].end, problem.stages[0].end * random.log_uniform(1e-5, 1e-3));
            for (index, count) in [(2, 1.0), (3, 2.0), (4, 3.0)] {
                problem.stages[index].end = from + count * thin;
            }
            near_rest(problem, if random.chance(0.5) { 0.3 } else { -0.1 })
        },
    },
    Family {
        name: "many-stages",
        draw: |random, _| {
            // Fast enough to pass them all.
            let ends = 9 + random.below(32);
            let mut problem = layered(random, ends, |random, scale, _| mixed(random, scale));
            problem.impact_speed *= 10.0;
            let exit = problem.stages[ends - 1].end * random.uniform(1.01, 1.3);
            Some(problem.with_exit(exit))
        },
    },
    Family {
        name: "no-length",
        // The first or a later one ends where it begins.
        draw: |random, _| {
            let mut problem = layered(random, 3, |random, scale, _| mixed(random, scale));
            let stage = if random.chance(0.5) { 0 } else { 1 + random.below(2) };
            problem.stages[stage].end = problem.start_of(stage);
            near_rest(problem, if random.chance(0.5) { 0.3 } else { -0.1 })
        },
    },
    Family { name: "several-viscous", draw: |random, _| Kind::SeveralViscous.draw(random) },
    Family {
        name: "driven-later",
        draw: |random, _| {
            let problem = layered(random, 2, |random, scale, index| {
                let mut law = mixed(random, scale);
                if index == 1 {
                    law.static_force *= -random.uniform(0.2, 1.0);
                }
                law
            });
            near_rest(problem, if random.chance(0.5) { 0.3 } else { -0.2 })
        },
    },
    Family {
        name: "through",
        // Hardly slowed: many boundaries lie in one step.
        draw: |random, _| {
            let mut problem = layered(random, 4, |random, scale, _| mixed(random, scale));
            let exit = problem.stages[3].end * random.uniform(1.01, 1.3);
            problem.impact_speed *= random.log_uniform(3.0, 30.0);
            Some(problem.with_exit(exit))
        },
    },
    Family {
        name: "stop-in-spring",
        draw: |random, _| {
            let problem = layered(random, 1, |random, scale, index| {
                scale.stage([0.0, random.log_uniform(0.5, 5.0) * f64::from(1 + index as u8), 0.0, 0.0])
            });
            near_rest(problem, random.uniform(0.1, 1.0))
        },
    },
    Family {
        name: "no-speed",
        draw: |random, _| {
            let scale = Scale::draw(random);
            let law = mixed(random, &scale);
            Some(Problem::of_stages(scale.mass, 0.0, [law]).with_exit(scale.length))
        },
    },
];

/// Slow questions, and the decade (a power of ten) of the impact speed (m/s) of each in turn. A threshold of an iteration in
/// m/s is nothing beside the speeds of projectiles, and hides until all of the flight is slower than it.
const SLOW: usize = 12;
const SLOW_SPEEDS: [i32; 2] = [-2, -1];

/// Questions of `seed` at impact speeds that no projectile has, through every term.
pub(super) fn slow_questions(seed: u64) -> Vec<Question> {
    let draw = |index: usize| {
        let mut random = Random::for_part(seed, &format!("diagnosis slow {index}"));
        let random = &mut random;
        (0..DRAWS_MAX).find_map(|_| {
            let speed = 10f64.powi(SLOW_SPEEDS[index % SLOW_SPEEDS.len()]) * random.log_uniform(1.2, 8.0);
            let scale = Scale { mass: random.log_uniform(1e-2, 1e2), speed, length: random.log_uniform(1e-2, 1.0) };
            let problem = match index / SLOW_SPEEDS.len() % 3 {
                0 => {
                    let shares = [0, 1, 2, 3].map(|_| random.log_uniform(0.2, 2.0));
                    Problem::of_stages(scale.mass, scale.speed, [scale.stage(shares)])
                }
                1 => layered_to(scale, random, 2, |random, scale, _| mixed(random, scale)),
                _ => layered_to(scale, random, 2, damped),
            };
            let problem = near_rest(problem, if random.chance(0.5) { 0.3 } else { -0.1 })?;
            Question::new(format!("slow-{}", index + 1), problem, None)
        })
    };
    (0..SLOW).filter_map(draw).collect()
}

/// Of so many questions, one is of the scales below.
const SCALED_EACH: usize = 8;
/// Decades (powers of ten) of the exit depth (m) and of the time there (s) that are asked in turn: without a common
/// divisor of their numbers, so that every depth meets every time. Caps on either show only beyond them.
const DEPTHS: [i32; 6] = [-3, -2, -1, 0, 1, 2];
const TIMES: [i32; 7] = [-5, -4, -3, -2, -1, 0, 1];

/// An exit, or every other time through the depths a rest, at the depth and the time of the scales with the number `round`:
/// of two or three times that depth at most.
fn scaled(random: &mut Random, round: usize) -> Problem {
    let mut of = |decade: i32| 10f64.powi(decade) * random.log_uniform(1.2, 8.0);
    // The deepest and the longest first: most caps lie there.
    let length = of(DEPTHS[DEPTHS.len() - 1 - round % DEPTHS.len()]);
    let time = of(TIMES[TIMES.len() - 1 - round % TIMES.len()]);
    let scale = Scale { mass: random.log_uniform(1e-2, 1e2), speed: length / time, length };
    let mut shares = [0, 1, 2, 3].map(|_| random.log_uniform(0.02, 0.2));
    if (round / DEPTHS.len()) % 2 == 1 {
        // Their work up to L is less than the energy: it rests beyond.
        shares = shares.map(|share| 0.5 * share);
        shares[0] = random.uniform(0.1, 0.2);
        return Problem::of_stages(scale.mass, scale.speed, [scale.stage(shares)]);
    }
    Problem::of_stages(scale.mass, scale.speed, [scale.stage(shares)]).with_exit(length)
}

/// Of so many questions, these repeat the one before them, of a scene and of stages: what a solver keeps of it shows.
const AGAIN_EACH: usize = 24;
const AGAIN: [usize; 2] = [4, 9];
/// What differs from the question before, in turn.
const INPUTS: [Input; 4] = [Input::Impact, Input::Mass, Input::Target, Input::Ends];
/// A number over that of the question before.
const NEXT_TO: f64 = 1.01;
/// Of so many questions of all families, one is of a physical scene.
const SCENES_EACH: usize = 4;
/// One question of so many asks for a projectile without speed.
const NO_SPEED_EACH: usize = 4;

/// `count` questions from `seed`; about physical scenes alone if `of_scenes`.
pub(super) fn questions(seed: u64, count: usize, of_scenes: bool) -> Vec<Question> {
    let mut asked = Vec::with_capacity(count);
    let mut scenes = Generator::new(seed, "diagnosis scenes");
    let mut choices = Random::for_part(seed, "diagnosis choices");
    let mut family = 0;
    let mut drawn = 0;
    // Every family has questions, so the draws are bounded only against a fault of the families themselves.
    while asked.len() < count && drawn < DRAWS_MAX * count {
        drawn += 1;
        let number = asked.len();
        if AGAIN.contains(&(number % AGAIN_EACH))
            && let Some(next) =
                asked.last().and_then(|before: &Question| before.again(INPUTS[number / AGAIN_EACH % INPUTS.len()]))
        {
            asked.push(next);
            continue;
        }
        if of_scenes || number % SCENES_EACH == SCENES_EACH - 1 {
            let scene = varied(scenes.next_scene(), &mut choices);
            let Ok(problem) = scene.problem() else { continue };
            asked.extend(Question::new(format!("scene-{}", number + 1), problem, Some(scene)));
            continue;
        }
        if number % SCALED_EACH == 2 {
            let round = number / SCALED_EACH;
            let mut random = Random::for_part(seed, &format!("diagnosis scales {round} {drawn}"));
            asked.extend(Question::new(format!("scales-{}", round + 1), scaled(&mut random, round), None));
            continue;
        }
        let Family { name, draw } = &FAMILIES[family % FAMILIES.len()];
        let round = family / FAMILIES.len();
        family += 1;
        if *name == "no-speed" && !round.is_multiple_of(NO_SPEED_EACH) {
            continue;
        }
        let mut random = Random::for_part(seed, &format!("diagnosis {name} {round}"));
        // The first has an exit, which a solver may keep.
        let is_wanted = |problem: &Problem| !asked.is_empty() || problem.has_exit();
        let found = (0..DRAWS_MAX).find_map(|_| {
            let problem = draw(&mut random, round).filter(is_wanted)?;
            Question::new(format!("{name}-{}", round + 1), problem, None)
        });
        asked.extend(found);
    }
    in_order(&mut asked);
    asked
}

/// Questions at the edges of what a solver may be asked, named by their cases in `verification/edges.toml`: `E3-1`.
pub(super) fn edge_questions() -> Vec<Question> {
    let of = |Case { id, problems, .. }: Case| {
        let numbered = problems.into_iter().enumerate();
        numbered.filter_map(move |(index, problem)| Question::new(format!("{id}-{}", index + 1), problem, None))
    };
    cases().into_iter().flat_map(of).collect()
}

/// `scene` with groups of a usual range, and in half of the cases with S left to Eq. 14.
fn varied(mut scene: Scene, random: &mut Random) -> Scene {
    let leaves_static_factor = random.chance(0.5);
    let asks_ndrc = random.chance(0.25);
    if let Resistance::Concrete(concrete) = &mut scene.resistance {
        // N* B below one, so that neither is mistaken for the other's absence.
        concrete.inertia_factor = random.uniform(0.5, 1.5);
        concrete.crater_ratio = random.uniform(0.5, 4.0);
        // Some by the criterion that lays the exit before the far side.
        if let Some(thickness) = scene.thickness.filter(|_| asks_ndrc) {
            scene.criterion = Criterion::Ndrc;
            scene.thickness = Some(thickness.max(concrete.diameter));
        }
        if leaves_static_factor {
            concrete.follows_eq14 = true;
            concrete.static_factor = crate::physics::semi_empirical::static_factor(concrete.strength);
        }
    }
    scene
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use strum::IntoEnumIterator;

    use super::*;

    /// Of the questions whatever they are called: what a cap on depth or on time would change.
    #[test]
    fn two_hundred_questions_end_at_every_decade_of_depth_and_of_time() {
        for seed in 1..=4 {
            let asked = questions(seed, 200, false);
            let of = |content| {
                let with = asked.iter().filter(move |question| question.contains.contains(&content));
                with.map(|question| question.exact.end).collect::<Vec<_>>()
            };
            let (exits, rests) = (of(Content::Exit), of(Content::Rest));
            let within = |decade: i32, of: &dyn Fn(&crate::physics::State) -> f64| {
                exits.iter().filter(|end| of(end).log10().floor() as i32 == decade).count()
            };
            for decade in DEPTHS {
                assert!(within(decade, &|end| end.depth) >= 2, "{seed}: exits at 1e{decade} m");
                let deeper = rests.iter().filter(|end| end.depth > 10f64.powi(decade)).count();
                assert!(deeper >= 2, "{seed}: rests beyond 1e{decade} m");
            }
            for decade in TIMES {
                assert!(within(decade, &|end| end.time) >= 1, "{seed}: exits at 1e{decade} s");
            }
        }
    }

    #[test]
    fn two_hundred_questions_hold_everything_that_a_flight_can_meet() {
        for seed in 1..=3 {
            let asked = questions(seed, 200, false);
            assert_eq!(asked.len(), 200);
            let mut counts = BTreeMap::new();
            for content in asked.iter().flat_map(|question| &question.contains) {
                *counts.entry(*content).or_insert(0) += 1;
            }
            for content in Content::iter() {
                let least = if content == Content::NoSpeed { 1 } else { 4 };
                assert!(counts.get(&content).is_some_and(|count| *count >= least), "{seed}: {content}: {counts:?}");
            }
        }
    }
}
