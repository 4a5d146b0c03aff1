//! What every integrator returns: outcome, ordered events, end state, margin with its error bound, cost.

use serde::Serialize;
use smallvec::SmallVec;
use thiserror::Error;

use crate::physics::{Advice, Event, EventKind, Outcome, Problem, Scalar, Shown, State};

/// How much of a flight to compute. What is not asked for is not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub enum Detail<'t> {
    /// Outcome and end state only; events inside the flight are not listed.
    End,
    /// And every event.
    #[default]
    Events,
    /// And every step.
    Trajectory,
    /// And in place of the steps the states at these times (s, ascending), by the method's own solution inside its steps:
    /// as accurate as its steps are. Times behind the end of the flight have no state.
    Times(&'t [f64]),
}

/// Work done for a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Cost {
    /// Accepted steps.
    pub steps: u64,
    /// Steps tried and thrown away.
    pub rejected_steps: u64,
    /// Evaluations of a stage's force. A Taylor step of order K counts K: one for each coefficient of the force.
    pub force_evaluations: u64,
}

impl std::ops::Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            rejected_steps: self.rejected_steps + other.rejected_steps,
            force_evaluations: self.force_evaluations + other.force_evaluations,
        }
    }
}

/// One row of a trajectory: a step's end, an event, or a time that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Sample {
    /// Time, depth, velocity.
    #[serde(flatten)]
    pub state: State,
    /// Force (N) in the stage below.
    #[serde(rename = "force_n")]
    pub force: f64,
    /// Index of the stage that gives the force.
    pub stage: usize,
}

/// The step limit of a fixed-step scheme, and whether the step respected it (`docs/theory.md`, section 5).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct StepLimit {
    /// Largest stable step (s); infinite, `null` in JSON, where there is no limit.
    #[serde(rename = "limit_s")]
    #[cfg_attr(feature = "report", schemars(with = "Option<f64>"))]
    pub limit: f64,
    /// Whether every step was within it.
    pub stable: bool,
}

/// Events of a flight in time order; four fit without an allocation.
pub type Events<S = f64> = SmallVec<[Event<S>; 4]>;

/// A finished flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight<S = f64> {
    /// How it ended.
    pub outcome: Outcome,
    /// Index from 0 of the stage in which it ended.
    pub stage: usize,
    /// State at the end: at rest `X, T, 0`; perforated: exit depth, time of exit, V_r.
    pub end: State<S>,
    /// Events in time order; at one place crater-end, exit, rest.
    pub events: Events<S>,
    /// Exit margin W(exit)/V0², continued below zero for a stop ([`crate::physics::exit_energy`]).
    ///
    /// `None` without an exit depth, or at no impact speed.
    pub exit_margin: Option<f64>,
    /// Error bound of the margin; the outcome is `Undecided` exactly when it is not exceeded.
    pub exit_margin_error: Option<f64>,
    /// Work done.
    pub cost: Cost,
    /// Every step and event, or the states at given times, when asked for.
    pub trajectory: Vec<Sample>,
    /// Step limit, for schemes that have one.
    pub step_limit: Option<StepLimit>,
    /// Choices of the method, with their reasons. [`super::Method::explain`] adds what the scene lets every method skip.
    pub notes: Vec<String>,
}

impl<S: Scalar> Flight<S> {
    /// State at the first event of `kind`, if it was reached.
    pub fn at(&self, kind: EventKind) -> Option<State<S>> {
        self.events.iter().find(|e| e.kind == kind).map(|e| e.state)
    }

    /// State at x = k d, if the flight reached it.
    pub fn crater_end(&self) -> Option<State<S>> {
        self.at(EventKind::CraterEnd)
    }

    /// Everything by value in `f64`.
    pub fn values(&self) -> Flight {
        Flight {
            outcome: self.outcome,
            stage: self.stage,
            end: self.end.values(),
            events: self.events.iter().map(|e| Event { kind: e.kind, state: e.state.values() }).collect(),
            exit_margin: self.exit_margin,
            exit_margin_error: self.exit_margin_error,
            cost: self.cost,
            trajectory: self.trajectory.clone(),
            step_limit: self.step_limit,
            notes: self.notes.clone(),
        }
    }
}

/// What a method gives.
pub type Solved<T = Flight> = Result<T, IntegrationError>;

/// Why an integration stopped without an answer.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum IntegrationError {
    /// The step budget ran out before the flight ended.
    #[error("no end of the flight within {max_steps} steps, stopped at {last}")]
    StepBudgetSpent {
        /// Steps allowed.
        max_steps: u64,
        /// What to do, by the method that ran.
        remedy: &'static str,
        /// State at the last step.
        last: State,
    },
    /// A number stopped being finite.
    #[error("{what} is not finite after {last}")]
    NotFinite {
        /// Which quantity.
        what: &'static str,
        /// Last finite state.
        last: State,
    },
    /// The flight has no end: nothing stops the projectile and there is no far side, or both are only approached.
    #[error("the flight never ends: {why}; reached {last}")]
    NeverEnds {
        /// What prevents an end.
        why: &'static str,
        /// State reached.
        last: State,
    },
    /// The table that gives the force ends where the projectile still moves.
    #[error(
        "the table of the force ends at x = {} m, and the projectile still has V = {} m/s there, t = {} s after impact",
        Shown(.last.depth), Shown(.last.velocity), Shown(.last.time)
    )]
    TableEnds {
        /// State at the last row.
        last: State,
    },
    /// The table of velocity that gives the force ends below the velocity that the projectile has.
    #[error(
        "the table of the force ends at V = {} m/s, and the projectile has V = {} m/s at x = {} m, t = {} s after impact",
        Shown(*.end), Shown(.last.velocity), Shown(.last.depth), Shown(.last.time)
    )]
    SpeedTableEnds {
        /// Velocity of the last row (m/s).
        end: f64,
        /// State from which it does not go on.
        last: State,
    },
    /// The method cannot treat this problem: a mistake of the caller, exit code 2.
    #[error("{method} cannot treat this scene: {why}")]
    Refused {
        /// Name of the method.
        method: &'static str,
        /// Reason and remedy.
        why: String,
    },
    /// An option outside its domain: a mistake of the caller, exit code 2.
    #[error("{option} = {value} is not allowed: {allowed}")]
    BadOption {
        /// Option name.
        option: &'static str,
        /// Value given.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The expression of a stage's force has no value where the flight goes.
    #[error("the force of stage {stage} has no value at x = {} m, V = {} m/s: {why}", Shown(last.depth), Shown(last.velocity))]
    NoForce {
        /// Index of the stage.
        stage: usize,
        /// Which part of the expression, and why.
        why: String,
        /// Where it has none.
        last: State,
    },
    /// The condition on which a stage ends has no value where the flight goes.
    #[error("the end of stage {stage} has no value at x = {} m, V = {} m/s: {why}", Shown(last.depth), Shown(last.velocity))]
    NoEnd {
        /// Index of the stage.
        stage: usize,
        /// Which part of the expression, and why.
        why: String,
        /// Where it has none.
        last: State,
    },
    /// The library behind the method gave up.
    #[error("{method} gave up after {last}: {cause}")]
    SolverFailed {
        /// Name of the method.
        method: &'static str,
        /// What the library said.
        cause: String,
        /// Last accepted state.
        last: State,
    },
}

impl IntegrationError {
    /// [`IntegrationError::BadOption`].
    pub(crate) fn bad_option(option: &'static str, value: &(impl ToString + ?Sized), allowed: &'static str) -> Self {
        Self::BadOption { option, value: value.to_string(), allowed }
    }
}

impl Advice for IntegrationError {
    fn is_usage(&self) -> bool {
        matches!(self, Self::Refused { .. } | Self::BadOption { .. })
    }

    fn help(&self) -> String {
        match self {
            Self::StepBudgetSpent { remedy, .. } => remedy,
            Self::NotFinite { .. } => "check the scene for forces beyond the range of 64-bit numbers",
            Self::NeverEnds { .. } => {
                "give each stage a force that resists at rest (static_force > 0), and the last one that or a thickness"
            }
            Self::TableEnds { .. } => {
                "add rows to the table, or end its stage (`end`) or the target (`thickness`) before its last row"
            }
            Self::SpeedTableEnds { .. } => "add rows to the table, up to the velocities that a projectile has there",
            Self::NoForce { .. } | Self::NoEnd { .. } => {
                "bound the argument with max or min, or end the stage before that place; where it has a value and no \
                 derivatives, --method tsit45 goes on"
            }
            Self::SolverFailed { .. } => "loosen --rtol, or take --method taylor",
            _ => "",
        }
        .to_owned()
    }

    fn last(&self) -> Option<State> {
        match self {
            Self::StepBudgetSpent { last, .. }
            | Self::NotFinite { last, .. }
            | Self::NeverEnds { last, .. }
            | Self::TableEnds { last }
            | Self::SpeedTableEnds { last, .. }
            | Self::NoForce { last, .. }
            | Self::NoEnd { last, .. }
            | Self::SolverFailed { last, .. } => Some(*last),
            _ => None,
        }
    }
}

/// Refuses a problem with a law of its own for `method`, which works with formulas of the four coefficients.
///
/// # Errors
/// [`IntegrationError::Refused`].
pub(crate) fn refuse_laws<S: Scalar>(problem: &Problem<S>, method: &'static str) -> Solved<()> {
    if problem.laws.is_empty() {
        return Ok(());
    }
    let why = if problem.laws.have_conditions() {
        "its formulas end stages at depths, and one ends at a speed or on a condition, or a mass joins there; \
         take --method taylor"
    } else {
        "its formulas are those of p + s x + r V + q V², and a stage has a law of its own; take --method taylor"
    };
    Err(IntegrationError::Refused { method, why: why.to_owned() })
}

/// The exit margin alone, without the flight around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// Exit margin W(exit)/V0², as [`Flight::exit_margin`].
    pub value: f64,
    /// Its error bound, as [`Flight::exit_margin_error`].
    pub error: Option<f64>,
    /// Work done.
    pub cost: Cost,
}

/// A method that solves a [`Problem`].
pub trait Integrator {
    /// Name of the method.
    fn name(&self) -> &'static str;

    /// Formal order of the method; `None` where it varies or where the answer is exact.
    fn order(&self) -> Option<u32> {
        None
    }

    /// Integrates `problem` from impact to rest or exit.
    ///
    /// # Errors
    /// [`IntegrationError`]: the method refuses the problem, or no end can be computed.
    fn solve(&self, problem: &Problem, detail: Detail) -> Solved;

    /// The exit margin of `problem`; `None` without an exit depth, or at no impact speed.
    ///
    /// Solves the whole flight unless a method has something shorter. The search for the critical velocity asks for
    /// nothing else.
    ///
    /// # Errors
    /// As [`Integrator::solve`].
    fn exit_margin(&self, problem: &Problem) -> Solved<Option<Margin>> {
        let flight = self.solve(problem, Detail::End)?;
        Ok(flight.exit_margin.map(|value| Margin { value, error: flight.exit_margin_error, cost: flight.cost }))
    }

    /// How the stages of `flight` were treated, one sentence each, for people.
    fn explain(&self, _problem: &Problem, _flight: &Flight) -> Vec<String> {
        Vec::new()
    }

    /// The same method, reusing its solver between calls, for many problems; `None` where a method has no such state.
    ///
    /// The answers are the same. Also `None` for a method that cannot start: each of its solutions says why.
    fn reusing(&self) -> Option<Box<dyn Integrator>> {
        None
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::flight::at_once;
    use crate::physics::{Laws, Stage, Target};

    fn problem(ends: &[f64], impact_speed: f64, exit_depth: f64) -> Problem {
        let stages = ends.iter().map(|&end| Stage { end, ..Stage::tunnel(1.0, 0.0) }).collect();
        Problem {
            mass: 1.0,
            impact_speed,
            exit_depth,
            stages,
            crater: None,
            target: Target::Stages,
            laws: Laws::none(),
        }
    }

    #[test]
    fn a_flight_that_never_starts_lists_what_lies_at_the_face() {
        let flight = |ends: &[f64], speed, exit| at_once(&problem(ends, speed, exit), Detail::Events).unwrap();
        let kinds = |flight: &Flight| flight.events.iter().map(|e| e.kind).collect::<Vec<_>>();
        let still = flight(&[0.0, 1.0, f64::INFINITY], 0.0, 2.0);
        assert_eq!((still.outcome, still.stage, still.exit_margin), (Outcome::Stopped, 1, None));
        assert_eq!(kinds(&still), [EventKind::StageEnd(0), EventKind::Rest]);
        assert_eq!(still.exit_margin_error, None);
        let bare = flight(&[f64::INFINITY], 3.0, 0.0);
        assert_eq!(
            (bare.outcome, bare.exit_margin, bare.exit_margin_error),
            (Outcome::Perforated, Some(1.0), Some(0.0))
        );
        assert_eq!(kinds(&bare), [EventKind::Exit]);
        let neither = flight(&[f64::INFINITY], 0.0, 0.0);
        assert_eq!((neither.outcome, neither.exit_margin), (Outcome::Perforated, None));
        assert_eq!(neither.exit_margin_error, None);
        assert_eq!(kinds(&neither), [EventKind::Exit, EventKind::Rest]);
        assert_eq!(at_once(&problem(&[f64::INFINITY], 3.0, 2.0), Detail::Events), None);
        let rows = at_once(&problem(&[f64::INFINITY], 0.0, 2.0), Detail::Times(&[0.0, 1.0])).unwrap().trajectory;
        assert_eq!(rows.iter().map(|row| row.state.time).collect::<Vec<_>>(), [0.0]);
        // A list whose last stage ends breaks an invariant; the stage named is one of the list all the same.
        assert_eq!(flight(&[0.0], 0.0, 2.0).stage, 0);
    }

    #[test]
    fn a_method_of_variable_order_names_none() {
        assert_eq!(crate::integrators::Taylor::default().order(), None);
    }

    #[test]
    fn costs_add_up_kind_by_kind() {
        let cost = Cost { steps: 2, rejected_steps: 3, force_evaluations: 5 };
        let sum = cost + Cost { steps: 7, rejected_steps: 11, force_evaluations: 13 };
        assert_eq!(sum, Cost { steps: 9, rejected_steps: 14, force_evaluations: 18 });
    }

    #[test]
    fn an_error_knows_whose_fault_it_is_and_what_to_change() {
        let last = State { time: 1.0, depth: 2.0, velocity: 3.0 };
        for (error, usage, help) in [
            (IntegrationError::StepBudgetSpent { max_steps: 1, remedy: "longer step", last }, false, "longer step"),
            (IntegrationError::NotFinite { what: "x", last }, false, "range of 64-bit"),
            (IntegrationError::NeverEnds { why: "x", last }, false, "thickness"),
            (IntegrationError::SolverFailed { method: "m", cause: String::new(), last }, false, "--rtol"),
            (IntegrationError::Refused { method: "m", why: String::new() }, true, ""),
            (IntegrationError::BadOption { option: "o", value: String::new(), allowed: "a" }, true, ""),
        ] {
            assert_eq!(error.is_usage(), usage, "{error}");
            assert_eq!(error.last(), (!usage).then_some(last), "{error}");
            assert!(if help.is_empty() { error.help().is_empty() } else { error.help().contains(help) }, "{error}");
        }
    }
}
