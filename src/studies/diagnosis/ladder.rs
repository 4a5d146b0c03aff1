//! To which limit do the answers of a solver go on a ladder of steps, and which scheme are they?
//!
//! Errors of a consistent scheme vanish with the step, at whatever order and with whatever noise the events make:
//!
//! ```text
//! e(h) = L + h (C + D h + noise)
//! ```
//!
//! L differs from zero where the scheme converges to something else. Divided by h the noise is even, and least squares
//! give L with its standard error; a limit that seems wrong is looked at again with finer steps.

use nalgebra::{Matrix3, Vector3};

use super::hypotheses::{How, predict};
use super::questions::{Content, Question};
use crate::exchange::peers::wire::errors;
use crate::integrators::VelocityAt;
use crate::integrators::central_difference::stability_limit;
use crate::physics::{EventKind, State};
use crate::studies::order::{StepError, fit};
use crate::studies::scheme_of_table::Scheme;

/// Steps of a ladder over the coarsest one: ratios that no event time is a multiple of.
pub(crate) const LADDER: [f64; 8] = [1.0, 0.7053, 0.4913, 0.3331, 0.2294, 0.1571, 0.1069, 0.0731];
/// Steps asked in addition where a limit seems wrong.
pub(super) const FINER: [f64; 4] = [0.0437, 0.0241, 0.0134, 0.0071];
/// Coarsest step over the duration of the flight.
const COARSEST: f64 = 1.0 / 30.0;
/// Largest step over the shortest stage passed.
const PART_OF_STAGE: f64 = 1.0 / 20.0;
/// Largest step over the stability limit of a stage.
const PART_OF_LIMIT: f64 = 0.5;
/// A question whose coarsest step is a smaller part of its flight is not asked.
const FINEST_START: f64 = 1.0 / 400.0;
/// Standard errors beyond which a limit is looked at again, and beyond which it is wrong.
pub(super) const SUSPECT: f64 = 8.0;
const WRONG: f64 = 12.0;
/// Relative error, times the condition, below which a limit is right.
const FLOOR: f64 = 1e-8;
/// Relative difference, before the condition, of an answer and a scheme that reproduces it.
pub(super) const REPRODUCED: f64 = 1e-10;
/// Steps that a time may lie off the end of one.
const WHOLE: f64 = 1e-6;
/// Part of the answers that a scheme must reproduce: whether a node falls on an event, round-off decides.
const REPRODUCED_PART: f64 = 0.97;

/// The coarsest step (s) for `question`; `None` where it asks for too many steps, or for what fixed steps cannot resolve.
pub(super) fn coarsest_step(question: &Question) -> Option<f64> {
    let exact = &question.exact;
    let unfit = [Content::Grazing, Content::ShortStage, Content::NoSpeed, Content::ExitAtStageEnd, Content::Stiff];
    if question.contains.iter().any(|content| unfit.contains(content)) {
        return None;
    }
    let duration = exact.end.time;
    let mut step = COARSEST * duration;
    let mut since = 0.0;
    for event in exact.events.iter().filter(|event| !matches!(event.kind, EventKind::Rest)) {
        step = step.min(PART_OF_STAGE * (event.state.time - since).max(f64::MIN_POSITIVE));
        since = event.state.time;
    }
    let fastest = exact.events.iter().map(|event| event.state.velocity).fold(question.problem.impact_speed, f64::max);
    for law in &question.problem.stages {
        let limit = stability_limit(law, question.problem.mass, fastest, VelocityAt::LaggedHalfStep);
        step = step.min(PART_OF_LIMIT * limit);
    }
    (step >= FINEST_START * duration).then_some(step)
}

/// An answer at a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rung {
    /// Step (s).
    pub step: f64,
    /// Numbers of the answer.
    pub answer: State,
    /// Whether its outcome is the right one.
    pub is_outcome_right: bool,
}

impl Rung {
    /// Whether the flight ends where a step does.
    pub(super) fn is_of_whole_steps(&self) -> bool {
        let steps = self.answer.time / self.step;
        (steps - steps.round()).abs() <= WHOLE
    }
}

/// The limit of one quantity as the step vanishes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    /// Its relative error.
    pub(crate) error: f64,
    /// The standard error of that.
    pub(crate) standard_error: f64,
    /// Error at the finest step.
    finest: f64,
}

impl Limit {
    /// The limit of `points`, each a step (s) and the relative error with it; `None` with too few.
    pub(crate) fn of(points: &[(f64, f64)]) -> Option<Self> {
        let freedom = points.len().checked_sub(3).filter(|freedom| *freedom > 0)?;
        let coarsest = points.iter().map(|(step, _)| *step).fold(0.0, f64::max);
        let row = |step: f64| Vector3::new(coarsest / step, 1.0, step / coarsest);
        let rows: Vec<_> = points.iter().map(|&(step, error)| (row(step), error * coarsest / step)).collect();
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (row, value) in &rows {
            normal += row * row.transpose();
            right += row * *value;
        }
        let inverse = normal.try_inverse()?;
        let solution = inverse * right;
        let squares: f64 = rows.iter().map(|(row, value)| (value - row.dot(&solution)).powi(2)).sum();
        Some(Self {
            error: solution[0],
            standard_error: (squares / freedom as f64 * inverse[(0, 0)]).sqrt().max(f64::EPSILON),
            finest: points.iter().min_by(|a, b| a.0.total_cmp(&b.0))?.1,
        })
    }

    /// Whether it may be wrong.
    pub(super) fn is_suspect(&self, condition: f64) -> bool {
        self.error.abs() > SUSPECT * self.standard_error && self.is_seen(condition)
    }

    /// Whether it is.
    pub(super) fn is_wrong(&self, condition: f64) -> bool {
        self.error.abs() > WRONG * self.standard_error && self.is_seen(condition)
    }

    fn is_seen(&self, condition: f64) -> bool {
        // What still falls at the finest step is no limit.
        self.error.abs() > FLOOR * condition && self.error.abs() > 0.5 * self.finest.abs()
    }
}

/// Relative errors of depth, time and velocity on each rung.
pub(super) fn rung_errors(question: &Question, rungs: &[Rung]) -> Vec<[f64; 3]> {
    rungs.iter().map(|rung| errors(rung.answer, question.exact.end, question.problem.impact_speed)).collect()
}

/// The schemes that reproduce `ladders`, of which one at least is needed.
pub(super) fn schemes(ladders: &[(&Question, &[Rung])]) -> Vec<(Scheme, f64)> {
    let mut found: Vec<(Scheme, f64)> = Vec::new();
    for scheme in Scheme::all() {
        let (mut reproduced, mut all, mut largest) = (0, 0, 0.0_f64);
        'ladders: for (question, rungs) in ladders {
            for rung in *rungs {
                all += 1;
                if let Some(difference) = difference(scheme, question, rung) {
                    reproduced += 1;
                    largest = largest.max(difference);
                }
                // Most schemes are out before the fine steps of the first question, which take the time.
                if f64::from(reproduced) < REPRODUCED_PART * f64::from(all) - 2.0 {
                    break 'ladders;
                }
            }
        }
        if all > 0 && f64::from(reproduced) >= REPRODUCED_PART * f64::from(all) {
            found.push((scheme, largest));
        }
    }
    found
}

/// Largest relative difference of `rung` from the scheme, if that reproduces it.
fn difference(scheme: Scheme, question: &Question, rung: &Rung) -> Option<f64> {
    let (problem, found) = predict(question, &[], How::Scheme(scheme, rung.step))?;
    let mut differences = errors(rung.answer, found.end, problem.impact_speed);
    if found.end.velocity <= 0.0 {
        // What a code prints for the velocity at rest is a matter of taste: zero, or that of the last step.
        differences[2] = 0.0;
    }
    let allowed = |i: usize| REPRODUCED * question.conditions[i];
    (0..3)
        .all(|i| differences[i].abs() <= allowed(i))
        .then(|| differences.iter().fold(0.0, |a, b| f64::max(a, b.abs())))
}

/// The order of one quantity over all ladders, by the mean square of their errors on each rung.
pub(super) fn pooled(ladders: &[(&Question, &[Rung])], which: usize) -> Vec<StepError> {
    let mut sums = [0.0; LADDER.len()];
    let mut count = 0;
    for (question, rungs) in ladders {
        let errors: Vec<f64> = rung_errors(question, rungs).iter().take(LADDER.len()).map(|all| all[which]).collect();
        let size = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt();
        // Round-off and what the problem fixes have no order.
        if errors.len() < LADDER.len() || !(size > 1e-9 * question.conditions[which]) {
            continue;
        }
        count += 1;
        for (sum, error) in sums.iter_mut().zip(&errors) {
            *sum += (error / size).powi(2);
        }
    }
    if count == 0 {
        return Vec::new();
    }
    let mean = |sum: f64| (sum / f64::from(count)).sqrt();
    LADDER.iter().zip(sums).map(|(step, sum)| StepError::new(*step, mean(sum))).collect()
}

/// The order over `ladders`, if there are enough errors above round-off.
pub(super) fn order(ladders: &[(&Question, &[Rung])], which: usize) -> Option<f64> {
    fit(&pooled(ladders, which)).ok()?.line.map(|line| line.order)
}
