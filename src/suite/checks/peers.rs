//! Other programs beside ours: recorded answers, or programs that run.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use schemars::JsonSchema;
use serde::Deserialize;

use super::super::claim::{Found, Measurement, NotMeasured};
use super::{Subject, Worst};
use crate::exchange::peers::{self, NO_LAWS, PeerAnswer, PeerRequest, PeerStartError, Recording, recordings};
use crate::integrators::Detail;
use crate::physics::Problem;
use crate::studies::diagnosis;

check! {
    /// Answers of another program: largest difference from the claim's method, over its conditioning and the tolerance.
    Peer {
        /// The recorded peer, or `user` for the one given on the command line.
        name: PeerName,
        /// Relative tolerance claimed.
        #[serde(deserialize_with = "crate::suite::checks::positive")]
        tolerance: f64,
    } in CrossCode, "tolerance", by agreement, compares (Method | Elsewhere);
    /// Faults that `diagnose` knows, at the number at which nothing is wrong: those that change an answer all the same.
    Neutral {
        /// How many questions about stages, and how many about scenes.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        questions: usize,
    } in CrossCode, "faults", by neutral, compares nothing;
    /// Solvers with one known fault each, exact but for it: those to which `diagnose` does not name it and its number first.
    NamedFaults {
        /// How many questions about stages, and how many about scenes.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        questions: usize,
        /// One fault of so many is tried.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        each: usize,
    } in CrossCode, "faults", by named_faults, compares nothing;
    /// Schemes of fixed steps, sound and with twice the drag: those to which `diagnose` does not say so.
    NamedSchemes {
        /// How many questions.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        questions: usize,
    } in CrossCode, "schemes", by named_schemes, compares nothing;
    /// Solvers with faults that no hypothesis computes, and right ones: those that are told anything but what stands beside them.
    ToldSolvers {
        /// Those are tried that are asked at most so many questions.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        questions: usize,
    } in CrossCode, "solvers", by told_solvers, compares nothing;
}

/// A program that claims ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema, strum::Display, strum::IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum PeerName {
    /// heyoka, Taylor series.
    HeyokaTaylor,
    /// CVODE of SUNDIALS, Adams' methods.
    SundaeAdams,
    /// CVODE of SUNDIALS, backward differentiation.
    SundaeBdf,
    /// IDA of SUNDIALS.
    SundaeIda,
    /// The one given on the command line.
    User,
}

/// Names by which claims ask for the recorded programs, in the order of [`recordings`].
const RECORDED: [&str; 4] = ["heyoka-taylor", "sundae-adams", "sundae-bdf", "sundae-ida"];

/// Name by which claims ask for the program given on the command line.
pub const USER: &str = "user";

/// Relative tolerance that a running peer is asked for: tight enough to judge it, loose enough for any solver.
const RTOL_USER: f64 = 1e-9;

/// Where the answers of other programs come from, by the name that claims use.
#[derive(Debug, Default)]
pub struct PeerAnswers {
    sources: BTreeMap<String, Source>,
}

#[derive(Debug)]
enum Source {
    /// Answers recorded earlier.
    Recorded(Box<Recording>),
    /// A program that failed before it could be asked: why, for the claim that meets it first.
    Failed(Mutex<GivenUp>, String),
    /// A program that is asked now.
    Running { peer: Box<Mutex<Asked>>, rtol: f64 },
}

/// A running peer and, once it has failed, where.
#[derive(Debug)]
struct Asked {
    peer: peers::Peer,
    given_up: GivenUp,
}

/// Where a peer failed, once a claim has said why: the others say no more than that.
#[derive(Debug, Default)]
struct GivenUp(Option<String>);

impl GivenUp {
    fn check(&self) -> Found<()> {
        match &self.0 {
            Some(place) => Err(NotMeasured::broken(format!("not asked: it failed {place}"))),
            None => Ok(()),
        }
    }
}

impl PeerAnswers {
    /// The recorded answers.
    ///
    /// # Errors
    /// Only if a shipped recording is broken, which a test excludes.
    pub fn recorded() -> Result<Self, serde_json::Error> {
        let sources = RECORDED
            .iter()
            .zip(recordings()?)
            .map(|(name, recording)| ((*name).to_owned(), Source::Recorded(Box::new(recording))))
            .collect();
        Ok(Self { sources })
    }

    /// Starts `command` and asks it in place of what was recorded under `name`.
    ///
    /// # Errors
    /// [`PeerStartError`]: it cannot be started, does not greet, or solves no stages to a tolerance.
    pub fn start(&mut self, name: &str, command: &str) -> Result<(), PeerStartError> {
        let peer = peers::Peer::start_adaptive(command)?;
        let rtol = match self.sources.get(name) {
            Some(Source::Recorded(recording)) => recording.rtol,
            _ => RTOL_USER,
        };
        let asked = Mutex::new(Asked { peer, given_up: GivenUp::default() });
        self.sources.insert(name.to_owned(), Source::Running { peer: Box::new(asked), rtol });
        Ok(())
    }

    /// Notes that the program `name` failed before it could be asked: its claims fail.
    pub fn fail(&mut self, name: &str, why: String) {
        self.sources.insert(name.to_owned(), Source::Failed(Mutex::default(), why));
    }

    /// Names and versions of the programs, for the report.
    pub fn describe(&self) -> Vec<(String, String)> {
        self.sources
            .iter()
            .map(|(name, source)| {
                let text = match source {
                    Source::Recorded(r) => {
                        format!(
                            "{} {} ({}), rtol {:e}, recorded {}",
                            r.program, r.version, r.method, r.rtol, r.recorded
                        )
                    }
                    Source::Failed(_, why) => why.clone(),
                    Source::Running { peer, rtol } => {
                        let asked = peer.lock().unwrap_or_else(PoisonError::into_inner);
                        let identity = asked.peer.identity();
                        format!("{identity}, rtol {rtol:e}, asked by `{}`", asked.peer.command())
                    }
                };
                (name.clone(), text)
            })
            .collect()
    }

    /// What the program `name` says of `problem`, which is the scene called `scene`.
    fn answer(&self, name: &str, scene: &str, problem: &Problem) -> Found<PeerAnswer> {
        let Some(source) = self.sources.get(name) else {
            return Err(NotMeasured::skip(if name == USER {
                "no program was given with --peer".to_owned()
            } else {
                format!("no answers of {name}")
            }));
        };
        if !problem.laws.is_empty() {
            return Err(NotMeasured::skip(NO_LAWS));
        }
        match source {
            Source::Recorded(recording) => {
                let flight = recording
                    .flights
                    .iter()
                    .find(|flight| flight.scene == scene)
                    .ok_or_else(|| NotMeasured::skip(format!("{name} was not asked for {scene}")))?;
                let (is_same, recipe) = (is_same(&flight.problem(), problem), &recording.recipe);
                holds!(is_same, "{scene} was recorded with other numbers: remake with `{recipe}`");
                Ok(flight.answer.clone())
            }
            Source::Failed(given_up, why) => {
                let mut given_up = given_up.lock().unwrap_or_else(PoisonError::into_inner);
                given_up.check()?;
                given_up.0 = Some("at its greeting".to_owned());
                Err(NotMeasured::broken(why))
            }
            Source::Running { peer, rtol } => {
                let mut asked = peer.lock().unwrap_or_else(PoisonError::into_inner);
                asked.given_up.check()?;
                asked.peer.ask(&PeerRequest::from_problem(problem, *rtol)).map_err(|failure| {
                    if !failure.is_reported() {
                        asked.given_up.0 = Some(format!("at {scene}"));
                    }
                    NotMeasured::broken(failure)
                })
            }
        }
    }
}

/// Whether two problems are the same but for the last digits of their coefficients.
fn is_same(a: &Problem, b: &Problem) -> bool {
    let close = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-14 * a.abs().max(b.abs());
    let numbers = |problem: &Problem| {
        let stages = problem.stages.iter().flat_map(|s| [s.static_force, s.stiffness, s.viscosity, s.drag, s.end]);
        [problem.mass, problem.impact_speed, problem.exit_depth].into_iter().chain(stages).collect::<Vec<_>>()
    };
    let (a, b) = (numbers(a), numbers(b));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| close(*a, *b))
}

fn agreement(&Peer { name, tolerance }: &Peer, subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let theirs = subject.context.peers.answer(name.into(), subject.scene_name()?, problem)?;
    let ours = subject.solution(Detail::Events)?;
    let differences = theirs.differences_from(&ours, problem).ok_or_else(|| {
        NotMeasured::broken(format!(
            "{name} says {} at x = {} m where {} is right (x = {} m)",
            theirs.outcome, theirs.depth_m, ours.outcome, ours.end.depth
        ))
    })?;
    if let Some(event) = theirs.left_out(&ours, problem) {
        let (kind, depth) = (event.kind.name(), event.state.depth);
        return Err(NotMeasured::broken(format!("{name} lists events, and not the {kind} at x = {depth} m")));
    }
    let mut worst = Worst { place: "nothing".to_owned(), ..Worst::default() };
    for difference in &differences {
        worst.take(difference.relative / difference.conditioning, || difference.quantity.clone());
    }
    let resolution = f64::EPSILON / tolerance;
    Ok(Measurement::new(worst.value / tolerance)
        .resolving(resolution)
        .remark(format!("largest in {}: {:.1e}", worst.place, worst.value)))
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn neutral(&Neutral { questions }: &Neutral, subject: &Subject<'_>) -> Found {
    let (answers, changed) = diagnosis::changed_by_nothing(subject.context.seed, questions);
    // No answer at all shows nothing.
    let value = if answers == 0 { f64::NAN } else { changed.len() as f64 };
    Ok(Measurement::new(value).remark(changed.join("; ")).cases(answers))
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn named_faults(&NamedFaults { questions, each }: &NamedFaults, _: &Subject<'_>) -> Found {
    Ok(misnamed(diagnosis::misnamed(SEED, questions, each)))
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn named_schemes(&NamedSchemes { questions }: &NamedSchemes, _: &Subject<'_>) -> Found {
    Ok(misnamed(diagnosis::misnamed_schemes(SEED, questions)))
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn told_solvers(&ToldSolvers { questions }: &ToldSolvers, _: &Subject<'_>) -> Found {
    Ok(misnamed(diagnosis::mistold(questions)))
}

/// Of the questions whether faults are named: with others, a few faults show in no answer, or as another fault would.
const SEED: u64 = 1;

/// How many were tried, and those that went without their name.
fn misnamed((tried, missed): (usize, Vec<String>)) -> Measurement {
    Measurement::count(missed.len()).remark(missed.join("; ")).cases(tried)
}
