//! The paper's explicit central difference scheme, with every choice that decides its order made visible.
//!
//! ```text
//! V(i+1/2) = V(i-1/2) + (dt(i+1) + dt(i))/2 a(i)        (Eq. 6)
//! x(i+1)   = x(i) + dt(i+1) V(i+1/2)                    (Eq. 7)
//! a(i)     = -F(x(i), V*)/M                             (Eq. 8)
//! V(-1/2)  = V0 - dt(1)/2 a(0),   a(0) = -F(0, V0)/M,   dt(0) = dt(1)
//! ```
//!
//! The state of step i is `(t(i), x(i), V(i))` with `V(i) = V(i-1/2) + dt(i)/2 a(i)`. With equal steps its time is
//! `i dt`, never a running sum, which is off by 4e-11 after 1e6 steps. Two choices decide the order: the velocity V*
//! in the force ([`VelocityAt`]) and the treatment of stage ends, exit and rest ([`Boundaries`]);
//! [`crate::studies::formal_order()`] knows the order of each combination.
//!
//! # Inside a step
//! Where a place inside a step is asked for, V runs linearly from V(i) to V(i+1), and x along the parabola
//! `x(i) + V(i) tau + a(i) tau²/2`, which meets x(i+1) exactly: a place between two nodes is always found, with one
//! square root and no iteration. Whole steps decide whether something happened: a stage end or the exit when x(i+1)
//! has reached it, rest when V(i+1) <= 0; in a step that comes to rest, also a place that the parabola touches before.
//!
//! # Source
//! Central difference operator of the paper, Eq. 6-8; orders, error constants and limits: `docs/theory.md`, section 5.

mod boundaries;
mod scheme;
mod stability;
#[cfg(test)]
pub(crate) mod tests;

use serde::Deserialize;

use super::flight::at_once;
use super::outcome::{Detail, Flight, IntegrationError, Integrator, Solved};
use crate::physics::{Problem, Scalar, State};
use boundaries::Run;
pub(crate) use boundaries::Step;
use scheme::Stepper;
pub use stability::{automatic_step, default_time_step, stability_limit};

/// Name of the method (`docs/reference.md`, "Words").
pub const NAME: &str = "central-difference";

/// Default of [`CentralDifference::max_steps`]: about half a second of computing.
pub const MAX_STEPS: u64 = 100_000_000;

/// Sizes of the time steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Steps {
    /// Chosen from the stages by [`default_time_step`].
    #[default]
    Default,
    /// Equal steps (s).
    Uniform(f64),
    /// A sequence of sizes (s), taken in order and started over when it is used up: two entries alternate. A step
    /// that [`Boundaries::Landed`] shortens uses up its entry.
    Given(Vec<f64>),
    /// As an explicit finite-element code chooses them: this factor times the longest step of the present stage at the present
    /// velocity, [`automatic_step`]; where the stage has none, the step before is kept. The first step is [`default_time_step`] where
    /// the first stage has none.
    Automatic(f64),
}

/// The velocity V* at which the force of step i is evaluated.
///
/// Where no force on the path depends on the velocity (the crater, a tunnel with Q = 0) all three are the same scheme.
/// At impact, and where [`Boundaries::Landed`] restarts at a stage end, V(i) itself is known and every rule uses it.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    Deserialize,
    strum::Display,
    strum::EnumString,
    strum::IntoStaticStr,
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum VelocityAt {
    /// `V* = V(i-1/2)`, which an explicit finite-element code hands to a user's subroutine: the paper's choice.
    /// First order as soon as the force depends on the velocity.
    #[default]
    #[cfg_attr(feature = "cli", value(name = "lagged"))]
    #[serde(rename = "lagged")]
    #[strum(serialize = "lagged")]
    LaggedHalfStep,
    /// `V* = V(i)`: the quadratic `V = V(i-1/2) - dt(i)/2 F(x(i), V)/M` solved for V. Second order; unconditionally
    /// stable as far as the drag goes. One evaluation, one square root and one division a step.
    Centred,
    /// `V* = V(i-1/2) - dt(i)/2 F(x(i), V(i-1/2))/M`: half a step ahead with the lagged force. Second order; two
    /// evaluations a step, and no equation to solve.
    #[cfg_attr(feature = "cli", value(name = "predicted"))]
    #[serde(rename = "predicted")]
    #[strum(serialize = "predicted")]
    PredictedHalfStep,
}

/// What is done about stage ends, exit depth and rest.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    Deserialize,
    strum::Display,
    strum::EnumString,
    strum::IntoStaticStr,
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Boundaries {
    /// Seen at the first whole step past them, the state not moved back: the paper's choice. Rest at the first
    /// V(i) <= 0, its depth the larger of the last two x.
    #[default]
    StepEnd,
    /// Located inside the step afterwards; the steps themselves are those of `step-end`.
    Interpolated,
    /// Stage ends are landed on: the step is shortened to `x(i) + V(i) dt + a(i) dt²/2 = end`, and the scheme starts
    /// afresh there, each half step with the force of its own side; the next step has its regular size again. Exit
    /// and rest are located inside the step. The only rule that keeps second order at a jump of the force.
    Landed,
}

/// How x and V are summed up over the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Summation {
    /// One rounding an addition.
    #[default]
    Plain,
    /// Kahan's: what an addition rounds off is added to the next increment. Lowers the round-off floor of long runs.
    Compensated,
}

impl VelocityAt {
    /// Every rule.
    pub const ALL: [Self; 3] = [Self::LaggedHalfStep, Self::Centred, Self::PredictedHalfStep];

    /// Name of the option.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

impl Boundaries {
    /// Every treatment.
    pub const ALL: [Self; 3] = [Self::StepEnd, Self::Interpolated, Self::Landed];

    /// Name of the option.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// The central difference scheme. The default is the paper's: lagged velocity, boundaries at step ends.
///
/// The outcome is the scheme's own at its step, without an error bound: never `Undecided`.
#[derive(Clone, Debug, PartialEq)]
pub struct CentralDifference {
    /// Sizes of the time steps.
    pub steps: Steps,
    /// Velocity in the force.
    pub velocity: VelocityAt,
    /// Treatment of stage ends, exit and rest.
    pub boundaries: Boundaries,
    /// Summation of x and V.
    pub summation: Summation,
    /// Steps allowed, at least 1.
    pub max_steps: u64,
}

impl Default for CentralDifference {
    fn default() -> Self {
        Self {
            steps: Steps::default(),
            velocity: VelocityAt::default(),
            boundaries: Boundaries::default(),
            summation: Summation::default(),
            max_steps: MAX_STEPS,
        }
    }
}

impl Integrator for CentralDifference {
    fn name(&self) -> &'static str {
        NAME
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        self.solve_in(problem, detail)
    }
}

impl CentralDifference {
    /// The scheme with equal steps of `time_step` (s) and plain sums.
    pub fn uniform(time_step: f64, velocity: VelocityAt, boundaries: Boundaries) -> Self {
        Self { steps: Steps::Uniform(time_step), velocity, boundaries, ..Self::default() }
    }

    /// The step (s) with which `problem` is solved: what a report prints. Of a given sequence, its largest; of automatic steps, the
    /// first.
    pub fn time_step<S: Scalar>(&self, problem: &Problem<S>) -> f64 {
        match &self.steps {
            Steps::Default => default_time_step(problem, self.velocity),
            Steps::Uniform(time_step) => *time_step,
            Steps::Given(sizes) => sizes.iter().copied().fold(0.0, f64::max),
            Steps::Automatic(safety) => {
                let at = State::at_impact(problem);
                let stage = problem.linear(scheme::stage_at(problem, 0, at.depth), at);
                let step = automatic_step(&stage.values(), problem.mass.value(), problem.impact_speed.value());
                step.map_or_else(|| default_time_step(problem, self.velocity), |step| safety * step)
            }
        }
    }

    /// Integrates `problem` in any number type; [`Integrator::solve`] is this in `f64`.
    ///
    /// Evaluations of the force: one at impact, one a step (two for [`VelocityAt::PredictedHalfStep`]), and one more
    /// at each stage end that is landed on. A step is rejected only when a landing is found within a step that was
    /// complete already (it came to rest and turned back before its end).
    ///
    /// # Errors
    /// - `BadOption`: a step or budget that is not positive and finite;
    /// - `StepBudgetSpent`: no end within [`Self::max_steps`];
    /// - `NotFinite`: x or V overflowed, as beyond the stability limit they may;
    /// - `NeverEnds`: no exit depth, and a last stage without a static force that resists; or the velocity died out
    ///   without a force at rest.
    pub fn solve_in<S: Scalar>(&self, problem: &Problem<S>, detail: Detail) -> Solved<Flight<S>> {
        self.check::<S>()?;
        match at_once(problem, detail) {
            Some(flight) => Ok(flight),
            None => Run::solve(self, problem, detail),
        }
    }

    /// The first `count` states of the scheme in the first stage, with all events off: the stage has no end, and the
    /// velocity may change its sign. For the study of stability and of round-off.
    ///
    /// # Errors
    /// `BadOption` as in [`Self::solve_in`]. States may overflow to infinity and NaN: that is what they are for.
    pub fn free_states<S: Scalar>(&self, problem: &Problem<S>, count: usize) -> Solved<Vec<State<S>>> {
        self.check::<S>()?;
        Ok(Stepper::new(self, problem).free(count))
    }

    /// The states of the scheme under an outer force `source(j, t)` (N) that drives, the stages parted by time:
    /// `M x'' = -F_j(x, x') + source(j, t)` until `ends[j]` (s), ascending, which is landed on as
    /// [`Boundaries::Landed`] lands on a stage end. All other events are off. For manufactured solutions.
    ///
    /// # Errors
    /// `BadOption` as in [`Self::solve_in`], or `ends` without a stage each; `StepBudgetSpent` before the last end. As
    /// with [`Self::free_states`] overflow is no error.
    pub fn forced_states<S: Scalar>(
        &self,
        problem: &Problem<S>,
        source: impl Fn(usize, S) -> S,
        ends: &[f64],
    ) -> Solved<Vec<State<S>>> {
        self.check::<S>()?;
        if ends.is_empty() || ends.len() > problem.stages.len() {
            let value = format!("{} times", ends.len());
            return Err(IntegrationError::bad_option("ends", &value, "one for each stage"));
        }
        Stepper::new(self, problem).forced(source, ends)
    }

    /// Refuses options outside their domain, as numbers of type `S`.
    fn check<S: Scalar>(&self) -> Solved<()> {
        let bad = |option, value: &str, allowed| Err(IntegrationError::bad_option(option, value, allowed));
        let is_bad = |size: &&f64| {
            let size = S::from_f64(**size).value();
            !(size > 0.0 && size.is_finite())
        };
        if self.max_steps == 0 {
            return bad("max_steps", "0", "at least 1");
        }
        let (sizes, option, allowed) = match &self.steps {
            Steps::Default => return Ok(()),
            Steps::Uniform(size) => (std::slice::from_ref(size), "--dt", "a positive, finite time"),
            Steps::Given(sizes) if sizes.is_empty() => return bad("steps", "[]", "at least one time step"),
            Steps::Given(sizes) => (sizes.as_slice(), "steps", "positive, finite times"),
            Steps::Automatic(safety) => (std::slice::from_ref(safety), "--steps auto", "a positive, finite factor"),
        };
        sizes.iter().find(is_bad).map_or(Ok(()), |size| bad(option, &format!("{size}"), allowed))
    }
}
