//! Error and cost of every method at every tolerance.
//!
//! The error of a run is the largest relative error of its quantities, against 50 digits from the same coefficients,
//! over max(1, condition number); of many scenes, the worst. A run with a wrong outcome, without an answer, or refused
//! is shown as such and counts at no accuracy.

use std::time::Instant;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::timing::{Effort, Timing};
use crate::integrators::central_difference::default_time_step;
use crate::integrators::lanes::Batch;
use crate::integrators::{
    Accuracy, Boundaries, CentralDifference, Detail, Flight, IntegrationError, Method, MethodName, MethodOptions,
    VelocityAt,
};
use crate::physics::reference::{self, Conditions, ExactFlight, Source};
use crate::physics::{Outcome, Problem, Scene};
use crate::studies::error::{Errors, StudyError, Truth, flight_error, free_quantities};
use crate::studies::quantity::Quantity;
use crate::studies::random_scenes::Generator;

/// The accuracies at which the fastest run of a method is sought.
pub const LEVELS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

/// A method whose pass over the scenes took longer than this is not tried at finer settings (s).
const PASS_S: f64 = 2.0;

/// Steps of the central difference over the default one ([`default_time_step`]), coarse to fine.
const STEPS_OVER_DEFAULT: [f64; 6] = [1000.0, 100.0, 10.0, 1.0, 0.1, 0.01];

/// What a flight is compared with.
#[derive(Clone, Debug)]
enum Reference {
    /// 50 digits, and how the problem itself magnifies errors of its inputs.
    Exact(Box<ExactFlight>, Conditions),
    /// The Taylor series to round-off, where nothing exact is known.
    Refined(Box<Flight>),
}

/// A problem and its answer.
#[derive(Clone, Debug)]
pub struct Known {
    /// The problem.
    pub problem: Problem,
    reference: Reference,
}

/// The judgement on one solution.
#[derive(Clone, Debug, PartialEq)]
pub enum Judgement {
    /// The right outcome, its largest error and where.
    Right(f64, Quantity),
    /// The method cannot decide the outcome.
    Undecided,
    /// No answer, another outcome than the exact one, an event too few or too many, or not a number.
    Failed(String),
}

impl Known {
    /// `problem` with 50 digits of its answer, or with a refined one.
    ///
    /// # Errors
    /// When it has neither.
    pub fn new(problem: Problem) -> Result<Self, IntegrationError> {
        let source = Source::Problem(&problem);
        let known = match (reference::flight(source), reference::conditions(source)) {
            (Ok(exact), Ok(conditions)) => Reference::Exact(Box::new(exact), conditions),
            _ => Reference::Refined(Box::new(Truth::of(&problem)?.flight)),
        };
        Ok(Self { problem, reference: known })
    }

    /// Whether the answer is known to 50 digits.
    pub fn is_exact(&self) -> bool {
        matches!(self.reference, Reference::Exact(..))
    }

    /// The error of `flight`; without `with_crater_end` the state at x = k d is left out.
    pub fn judge(&self, flight: &Flight, with_crater_end: bool) -> Judgement {
        if flight.outcome == Outcome::Undecided {
            return Judgement::Undecided;
        }
        let exact = match &self.reference {
            Reference::Exact(exact, _) => exact.outcome,
            Reference::Refined(refined) => refined.outcome,
        };
        if !flight.outcome.agrees_with(exact) {
            return Judgement::Failed(format!("{} in place of {exact}", flight.outcome));
        }
        let mut worst = (0.0, Quantity::Depth);
        for (error, quantity) in self.errors(flight) {
            if quantity.is_at_crater_end() && !with_crater_end {
                continue;
            }
            if !error.is_finite() {
                return Judgement::Failed(if quantity.is_at_crater_end() {
                    "x = k d is an event too few or too many".to_owned()
                } else {
                    format!("{quantity} is not a number")
                });
            }
            if error > worst.0 {
                worst = (error, quantity);
            }
        }
        Judgement::Right(worst.0, worst.1)
    }

    /// Relative errors of a flight with the right outcome, over max(1, condition number) where that is known.
    fn errors(&self, flight: &Flight) -> Vec<(f64, Quantity)> {
        match &self.reference {
            Reference::Exact(exact, conditions) => {
                let errors = Errors::in_50_digits(flight, exact, conditions).0;
                errors.into_iter().map(|(error, quantity)| (error * f64::EPSILON, quantity)).collect()
            }
            Reference::Refined(refined) => free_quantities(refined)
                .map(|quantity| {
                    let error = flight_error(quantity, flight, refined, self.problem.impact_speed);
                    (error.map_or(f64::NAN, f64::abs), quantity)
                })
                .collect(),
        }
    }
}

/// What is solved: one scene, or many one after the other.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name.
    pub name: String,
    /// Title.
    pub title: Option<String>,
    /// The problems and their answers.
    pub problems: Vec<Known>,
}

impl Case {
    /// The case of one scene.
    ///
    /// # Errors
    /// [`StudyError`].
    pub fn of_scene(name: &str, scene: &Scene) -> Result<Self, StudyError> {
        let problems = vec![Known::new(scene.problem()?)?];
        Ok(Self { name: name.to_owned(), title: scene.title.clone(), problems })
    }

    /// `count` varied scenes from a seed: repeating one scene flatters a method whose branches the processor learns.
    ///
    /// # Errors
    /// [`StudyError`].
    pub fn varied(count: usize, seed: u64) -> Result<Self, StudyError> {
        let mut generator = Generator::new(seed, "bench");
        let scenes: Vec<Scene> = (0..count).map(|_| generator.next_scene()).collect();
        let problems =
            scenes.par_iter().map(|scene| Ok(Known::new(scene.problem()?)?)).collect::<Result<_, StudyError>>()?;
        let title = Some(format!("{count} scenes from seed {seed}, worst error and mean time"));
        Ok(Self { name: "varied".to_owned(), title, problems })
    }
}

/// Whose runs they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contender {
    /// A method of the program.
    Method(MethodName),
    /// The paper's scheme in one variant.
    Scheme(VelocityAt, Boundaries),
    /// The Taylor series in lanes, many scenes at once.
    Batch,
}

/// How accurate a contender is asked to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// Relative tolerance.
    Tolerance(f64),
    /// As accurate as the numbers allow.
    RoundOff,
    /// Time step over the default one of the scene.
    Step(f64),
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Tolerance(rtol) => write!(f, "{rtol:.0e}"),
            Self::RoundOff => f.write_str("eps"),
            Self::Step(factor) => write!(f, "{factor}dt"),
        }
    }
}

/// Solves one problem.
type SolveOne = dyn Fn(&Problem) -> Result<Flight, IntegrationError>;

impl Contender {
    /// Every contender of this build: each method, the paper's variant of its scheme and the most accurate one.
    pub fn all() -> Vec<Self> {
        let mut all: Vec<_> =
            MethodName::built().filter(|name| name.accuracy() != Accuracy::Step).map(Self::Method).collect();
        all.insert(1, Self::Batch);
        all.push(Self::Scheme(VelocityAt::LaggedHalfStep, Boundaries::StepEnd));
        all.push(Self::Scheme(VelocityAt::Centred, Boundaries::Landed));
        all
    }

    /// Name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Method(name) => name.to_string(),
            Self::Scheme(velocity, boundaries) => variant_name(velocity, boundaries),
            Self::Batch => "taylor, in lanes".to_owned(),
        }
    }

    /// Its settings, coarse to fine.
    pub fn settings(self) -> Vec<Setting> {
        let tolerances = |finest: i32| (2..=finest).map(|digits| Setting::Tolerance(10f64.powi(-digits)));
        match self {
            Self::Batch => vec![Setting::RoundOff],
            Self::Scheme(..) => STEPS_OVER_DEFAULT.into_iter().map(Setting::Step).collect(),
            Self::Method(name) => match name.accuracy() {
                Accuracy::Exact => vec![Setting::RoundOff],
                Accuracy::RoundOff => tolerances(15).chain([Setting::RoundOff]).collect(),
                Accuracy::Tolerance | Accuracy::Step => tolerances(14).collect(),
            },
        }
    }

    /// The function that solves one problem, and that reuses what the method stores between solutions.
    fn solver(self, setting: Setting) -> Result<Box<SolveOne>, IntegrationError> {
        Ok(match self {
            Self::Batch => Box::new(|problem| {
                Batch::new().solve(std::slice::from_ref(problem)).remove(0).map(|summary| summary.flight())
            }),
            Self::Scheme(velocity, boundaries) => {
                let factor = if let Setting::Step(factor) = setting { factor } else { 1.0 };
                Box::new(move |problem| {
                    let step = factor * default_time_step(problem, velocity);
                    CentralDifference::uniform(step, velocity, boundaries).solve_in(problem, Detail::Events)
                })
            }
            Self::Method(name) => {
                let rtol = if let Setting::Tolerance(rtol) = setting { Some(rtol) } else { None };
                let method = Method::new(name, &MethodOptions { rtol, ..MethodOptions::default() })?;
                let reused = method.integrator().reusing();
                Box::new(move |problem| reused.as_deref().unwrap_or(method.integrator()).solve(problem, Detail::Events))
            }
        })
    }
}

/// Name of a variant of the paper's scheme in tables.
pub fn variant_name(velocity: VelocityAt, boundaries: Boundaries) -> String {
    format!("{velocity}/{boundaries}")
}

/// The judgement on all solutions of a run: the worst.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema, strum::Display)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "lowercase")]
pub enum RunState {
    /// Every flight has the right outcome.
    #[default]
    Right,
    /// A flight is undecided, the others are right.
    Undecided,
    /// A flight has a wrong outcome or none.
    Failed,
    /// Not tried, because a coarser setting already took too long.
    #[strum(to_string = "not run")]
    NotRun,
}

/// One contender at one setting on one case.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Run {
    /// Case.
    pub scene: String,
    /// Contender.
    pub method: String,
    /// Setting in short: a tolerance, `eps` for round-off, or a step in default steps such as `10dt`.
    pub setting: String,
    /// Relative tolerance; `null` for round-off, an exact answer, or a fixed step.
    pub rtol: Option<f64>,
    /// Step over the default step of the scene, for the paper's scheme.
    pub step_over_default: Option<f64>,
    /// The worst judgement on its solutions.
    pub state: RunState,
    /// Flights with the right outcome.
    pub right: usize,
    /// Flights that the method calls undecided.
    pub undecided: usize,
    /// Flights with a wrong outcome or none.
    pub failed: usize,
    /// The first reason why the run is not right; `null` when it is.
    pub reason: Option<String>,
    /// Largest error of the right flights, over max(1, condition number); `null` without any.
    pub error: Option<f64>,
    /// The quantity of that error.
    pub quantity: Option<Quantity>,
    /// Mean evaluations of the force a flight; `null` where they are not counted.
    pub force_evaluations: Option<f64>,
    /// Time of one flight, the mean over the scenes of the case; `null` when nothing was solved.
    pub time: Option<Timing>,
}

/// Judgements of a run, added up.
#[derive(Debug)]
pub(super) struct Tally {
    run: Run,
    evaluations: u64,
    counted: usize,
}

impl Tally {
    pub(super) fn new(case: &Case, method: &str, setting: Setting) -> Self {
        let run = Run {
            scene: case.name.clone(),
            method: method.to_owned(),
            setting: setting.to_string(),
            rtol: if let Setting::Tolerance(rtol) = setting { Some(rtol) } else { None },
            step_over_default: if let Setting::Step(factor) = setting { Some(factor) } else { None },
            ..Run::default()
        };
        Self { run, evaluations: 0, counted: 0 }
    }

    pub(super) fn add(&mut self, judgement: Judgement, force_evaluations: Option<u64>) {
        let run = &mut self.run;
        let reason = match judgement {
            Judgement::Right(error, quantity) => {
                run.right += 1;
                if run.error.is_none_or(|worst| error > worst) {
                    (run.error, run.quantity) = (Some(error), Some(quantity));
                }
                None
            }
            Judgement::Undecided => {
                run.undecided += 1;
                run.state = run.state.max(RunState::Undecided);
                Some("inside its error bar".to_owned())
            }
            Judgement::Failed(why) => {
                run.failed += 1;
                // A failure says more than an undecided solution before it.
                if run.state < RunState::Failed {
                    run.reason = None;
                }
                run.state = RunState::Failed;
                Some(why)
            }
        };
        if run.reason.is_none() {
            run.reason = reason;
        }
        if let Some(count) = force_evaluations {
            self.evaluations += count;
            self.counted += 1;
        }
    }

    pub(super) fn finish(mut self, time: Option<Timing>) -> Run {
        self.run.force_evaluations = (self.counted > 0).then(|| self.evaluations as f64 / self.counted as f64);
        self.run.time = time;
        self.run
    }

    /// A run that was not tried.
    pub(super) fn not_run(mut self, why: &str) -> Run {
        self.run.state = RunState::NotRun;
        self.run.reason = Some(why.to_owned());
        self.run
    }
}

/// Every setting of `contender` on `case`, coarse to fine. Errors of the contender are runs that failed.
pub fn runs(case: &Case, contender: Contender, effort: Effort) -> Vec<Run> {
    until_too_long(case, &contender.name(), contender.settings(), PASS_S, |setting, tally| {
        run(case, contender, setting, effort, tally)
    })
}

/// A run for each of `settings`, coarse to fine. Once a pass over the scenes takes longer than `pass_max` (s), the finer
/// settings are not tried.
pub(super) fn until_too_long(
    case: &Case,
    name: &str,
    settings: Vec<Setting>,
    pass_max: f64,
    mut run: impl FnMut(Setting, Tally) -> Run,
) -> Vec<Run> {
    let mut too_long: Option<String> = None;
    let mut run_of = |setting| {
        let tally = Tally::new(case, name, setting);
        if let Some(why) = &too_long {
            return tally.not_run(why);
        }
        let started = Instant::now();
        let run = run(setting, tally);
        let pass = run.time.map_or(0.0, |time| time.median_ns * case.problems.len() as f64 * 1e-9);
        if pass > pass_max {
            too_long = Some(format!("{setting} took {:.0} s", started.elapsed().as_secs_f64()));
        }
        run
    };
    settings.into_iter().map(&mut run_of).collect()
}

fn run(case: &Case, contender: Contender, setting: Setting, effort: Effort, mut tally: Tally) -> Run {
    let solver = contender.solver(setting);
    for known in &case.problems {
        match solver.as_ref().map_err(Clone::clone).and_then(|solve| solve(&known.problem)) {
            Ok(flight) => tally.add(known.judge(&flight, true), Some(flight.cost.force_evaluations)),
            Err(error) => tally.add(Judgement::Failed(error.to_string()), None),
        }
    }
    // How long it takes to give no answer at all is of no use to anybody.
    let Some(solve) = solver.ok().filter(|_| tally.counted > 0) else { return tally.finish(None) };
    if contender == Contender::Batch {
        return tally.finish(Some(time_in_lanes(case, effort)));
    }
    let timing = effort.time(&mut || {
        for known in &case.problems {
            let _ = std::hint::black_box(solve(std::hint::black_box(&known.problem)));
        }
    });
    tally.finish(Some(timing.over(case.problems.len())))
}

/// Time of a scene in lanes: the case repeated until the lanes are full.
fn time_in_lanes(case: &Case, effort: Effort) -> Timing {
    const FULL: usize = 1024;
    let problems: Vec<Problem> = case.problems.iter().map(|known| known.problem.clone()).cycle().take(FULL).collect();
    let batch = Batch::new();
    // One pass before the clock runs, as every other method has had.
    std::hint::black_box(batch.solve(&problems));
    effort.time(&mut || drop(std::hint::black_box(batch.solve(std::hint::black_box(&problems))))).over(FULL)
}

/// The fastest run of a method within an accuracy.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Fastest {
    /// Case.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Largest error allowed.
    pub level: f64,
    /// Median time of a flight (ns); `null` when no run is as accurate.
    pub time_ns: Option<f64>,
    /// Setting of that run.
    pub setting: Option<String>,
    /// Its evaluations of the force a flight.
    pub force_evaluations: Option<f64>,
}

/// The fastest run of each method on each case at each of [`LEVELS`]; only runs whose flights are all right count.
pub fn fastest(runs: &[Run]) -> Vec<Fastest> {
    let of_method = |runs: &[Run], level| {
        let best = fastest_of(runs, level);
        Fastest {
            scene: runs[0].scene.clone(),
            method: runs[0].method.clone(),
            level,
            time_ns: best.map(|(_, time)| time),
            setting: best.map(|(run, _)| run.setting.clone()),
            force_evaluations: best.and_then(|(run, _)| run.force_evaluations),
        }
    };
    by_method(runs).flat_map(|runs| LEVELS.map(|level| of_method(runs, level))).collect()
}

/// The runs of each method on each case.
pub fn by_method(runs: &[Run]) -> impl Iterator<Item = &[Run]> {
    runs.chunk_by(|a, b| a.scene == b.scene && a.method == b.method)
}

/// The least error of those of `runs` whose flights are all right.
pub fn least_error(runs: &[Run]) -> Option<f64> {
    let right = runs.iter().filter(|run| run.state == RunState::Right);
    right.filter_map(|run| run.error).min_by(f64::total_cmp)
}

/// The fastest of `runs`, all of one method, within the error `level`, and its median time (ns).
pub fn fastest_of(runs: &[Run], level: f64) -> Option<(&Run, f64)> {
    let is_within = |run: &&Run| run.state == RunState::Right && run.error.is_some_and(|error| error <= level);
    let timed = runs.iter().filter(is_within).filter_map(|run| Some((run, run.time?.median_ns)));
    timed.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::exchange::scene_file::SHIPPED;
    use crate::integrators::{ClosedForm, Integrator};

    fn tunnel() -> Case {
        let text = SHIPPED.iter().find(|(name, _)| *name == "tunnel").unwrap().1;
        Case::of_scene("tunnel", &Scene::from_toml(text, "tunnel").unwrap()).unwrap()
    }

    fn run_of(judgements: &[Judgement], setting: Setting, time_ns: f64) -> Run {
        let mut tally = Tally::new(&tunnel(), "a method", setting);
        for judgement in judgements {
            tally.add(judgement.clone(), Some(10));
        }
        tally.finish(Timing::of(vec![time_ns]))
    }

    #[test]
    fn only_runs_that_are_right_throughout_count_as_fast_however_fast_the_others_are() {
        let right = Judgement::Right(1e-7, Quantity::Depth);
        let runs = [
            run_of(&[right.clone(), Judgement::Failed("lost".into())], Setting::Tolerance(1e-2), 1.0),
            run_of(&[right.clone(), Judgement::Undecided], Setting::Tolerance(1e-3), 2.0),
            run_of(&[Judgement::Failed("no end".into())], Setting::Tolerance(1e-4), 3.0),
            run_of(&[right.clone(), Judgement::Right(1e-4, Quantity::Time)], Setting::Tolerance(1e-5), 4.0),
            run_of(&[right.clone(), right], Setting::Tolerance(1e-6), 5.0),
        ];
        let states: Vec<_> = runs.iter().map(|run| run.state).collect();
        let expected = [RunState::Failed, RunState::Undecided, RunState::Failed, RunState::Right, RunState::Right];
        assert_eq!(states, expected);
        assert_eq!((runs[0].right, runs[0].failed, runs[0].reason.as_deref()), (1, 1, Some("lost")));
        // The worst of a run is its error; what is not judged right has none.
        assert_eq!((runs[3].error, runs[3].quantity), (Some(1e-4), Some(Quantity::Time)));
        assert_eq!(runs[2].error, None);
        let times: Vec<_> = fastest(&runs).iter().map(|fastest| fastest.time_ns).collect();
        assert_eq!(times, [Some(4.0), Some(5.0), None, None]);
    }

    #[test]
    fn a_flight_is_judged_by_its_outcome_its_events_and_its_numbers() {
        let known = &tunnel().problems[0];
        let right = ClosedForm.solve(&known.problem, Detail::Events).unwrap();
        assert!(matches!(known.judge(&right, true), Judgement::Right(error, _) if error < 1e-15));
        let mut off = right.clone();
        off.end.depth *= 1.0 + 1e-3;
        // Over the condition number of the depth, a few units.
        assert!(matches!(known.judge(&off, true), Judgement::Right(error, Quantity::Depth) if error > 1e-4));
        let perforated = Flight { outcome: Outcome::Perforated, ..right.clone() };
        assert!(matches!(known.judge(&perforated, true), Judgement::Failed(_)));
        let undecided = Flight { outcome: Outcome::Undecided, ..right.clone() };
        assert_eq!(known.judge(&undecided, true), Judgement::Undecided);
        let mut silent = right.clone();
        silent.events.clear();
        assert!(matches!(known.judge(&silent, true), Judgement::Failed(_)));
        assert!(matches!(known.judge(&silent, false), Judgement::Right(..)), "a peer need not list events");
        let mut lost = right;
        lost.end.time = f64::NAN;
        assert!(matches!(known.judge(&lost, true), Judgement::Failed(_)));
    }
}
