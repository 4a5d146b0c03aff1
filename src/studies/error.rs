//! How far off is a solution? The true answer, the error of each quantity, and what a scene itself does to rounding.
//!
//! Depth and times are judged relative to the true value, velocities relative to V0 (`docs/reference.md`, "Words").

use std::cmp::Ordering;

use num_dual::Dual64;
use thiserror::Error;
use twofloat::TwoFloat;

use super::critical_velocity::CriticalError;
use super::quantity::Quantity;
use crate::integrators::{ClosedForm, Detail, Flight, IntegrationError, Integrator, Taylor};
use crate::physics::parameter::ParameterError;
use crate::physics::reference::{Conditions, ExactFlight, ReferenceError};
use crate::physics::{Advice, Outcome, Problem, ResolveError, Scalar, Shown, State, closed_form};

/// What the study of a scene gives.
pub type Studied<T> = Result<T, StudyError>;

/// Why a scene cannot be studied.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StudyError {
    /// It does not resolve.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// A problem has no solution.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// The search for its critical velocity failed.
    #[error(transparent)]
    Critical(#[from] CriticalError),
    /// Its critical velocity has no closed form.
    #[error(transparent)]
    NoClosedForm(#[from] closed_form::CriticalError),
    /// It has no critical velocity.
    #[error("there is no critical velocity: {0}")]
    NoCritical(String),
    /// Neither the simulation nor Eq. 15 asks for energy, and the difference of the two in percent is 0/0.
    #[error("there is no difference from Eq. 15 at H/d = {}: both energies are 0", Shown(*.0))]
    NoDifference(f64),
    /// One of its numbers.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// It has no reference in 50 digits.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The outcomes differ, and not within the error bar.
    #[error("outcome {found}, in 50 digits {exact}")]
    Outcome {
        /// Outcome found.
        found: Outcome,
        /// Outcome of the reference.
        exact: Outcome,
    },
}

impl Advice for StudyError {
    fn inner(&self) -> Option<&dyn Advice> {
        match self {
            Self::Resolve(error) => Some(error),
            Self::Integration(error) => Some(error),
            Self::Critical(error) => Some(error),
            Self::Parameter(error) => Some(error),
            _ => None,
        }
    }

    fn is_usage(&self) -> bool {
        self.inner().is_some_and(Advice::is_usage)
    }
}

/// The true solution of a problem, or a refined one where no closed form exists.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The solution.
    pub flight: Flight,
    /// Whether it is exact, and not the refined solution of a method.
    pub is_exact: bool,
}

impl Truth {
    /// The closed form, else the Taylor series to round-off.
    ///
    /// # Errors
    /// When neither has an answer.
    pub fn of(problem: &Problem) -> Result<Self, IntegrationError> {
        match ClosedForm.solve(problem, Detail::Events) {
            Ok(flight) => Ok(Self { flight, is_exact: true }),
            Err(_) => Ok(Self { flight: Taylor::default().solve(problem, Detail::Events)?, is_exact: false }),
        }
    }
}

/// Value of `quantity` in `flight`; `None` for what the flight does not have.
///
/// The critical velocity is no quantity of one flight.
pub fn value_of<S: Scalar>(quantity: Quantity, flight: &Flight<S>) -> Option<S> {
    let State { time, depth, velocity } = if quantity.is_at_crater_end() { flight.crater_end()? } else { flight.end };
    match quantity {
        Quantity::Depth => Some(depth),
        Quantity::Time | Quantity::CraterEndTime => Some(time),
        Quantity::Velocity | Quantity::CraterEndVelocity => Some(velocity),
        Quantity::CriticalVelocity => None,
    }
}

/// Error with its sign of `value` against `exact`: over `exact`, or over `impact_speed` (m/s) for velocities of a flight.
///
/// Zero when both are the same number, also where the scale is zero.
pub fn signed_error(quantity: Quantity, value: f64, exact: f64, impact_speed: f64) -> f64 {
    let scale = error_scale(quantity, exact, impact_speed);
    if value == exact { 0.0 } else { (value - exact) / scale }
}

/// What the errors of `quantity` are relative to: its `exact` value, or `impact_speed` (m/s) for velocities of a flight.
pub fn error_scale(quantity: Quantity, exact: f64, impact_speed: f64) -> f64 {
    if quantity.is_over_impact_speed() { impact_speed } else { exact }
}

/// Error with its sign of `quantity` of `flight` against `exact`; `None` where the outcomes differ, where either
/// flight lacks the quantity, or where the error is not a number.
pub fn flight_error(quantity: Quantity, flight: &Flight, exact: &Flight, impact_speed: f64) -> Option<f64> {
    if !flight.outcome.agrees_with(exact.outcome) {
        return None;
    }
    let (value, exact) = value_of(quantity, flight).zip(value_of(quantity, exact))?;
    Some(signed_error(quantity, value, exact, impact_speed)).filter(|e| e.is_finite())
}

/// Whether the scene fixes `quantity`: the depth of a perforation, the velocity at rest, a crater end not reached.
pub fn is_fixed(quantity: Quantity, exact: &Flight) -> bool {
    match quantity {
        Quantity::Depth => !exact.outcome.is_stop(),
        Quantity::Velocity => exact.outcome.is_stop(),
        Quantity::CraterEndTime | Quantity::CraterEndVelocity => exact.crater_end().is_none(),
        Quantity::Time => false,
        Quantity::CriticalVelocity => exact.exit_margin.is_none(),
    }
}

/// The quantities of one flight that the scene leaves free.
pub fn free_quantities(exact: &Flight) -> impl Iterator<Item = Quantity> {
    Quantity::OF_A_FLIGHT.into_iter().filter(|quantity| !is_fixed(*quantity, exact))
}

/// Whether `value` is beyond `limit`; what is not a number is.
pub fn exceeds(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}

/// Order of two errors, in which a NaN is larger than every number.
pub fn compare(a: f64, b: f64) -> Ordering {
    a.is_nan().cmp(&b.is_nan()).then(a.total_cmp(&b))
}

/// Units of round-off of W/V0², over max(1, condition number), up to which rounding may decide whether an event is there.
const TIE: f64 = 64.0;

/// Absolute errors of the quantities of one flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors(pub Vec<(f64, Quantity)>);

impl Errors {
    /// Of `flight` against `exact`, in units of round-off: the difference in double-double.
    ///
    /// The crater's end that only one of them lists counts with W/V0² there, whose sign decides the event.
    pub fn in_double_double(flight: &Flight, exact: &Flight<TwoFloat>, impact_speed: f64) -> Self {
        let error = |quantity: Quantity| {
            let (value, exact) = match (value_of(quantity, flight), value_of(quantity, exact)) {
                (Some(value), Some(exact)) => (value, exact),
                (value, exact) if quantity == Quantity::CraterEndVelocity => {
                    let velocity = value.or(exact.map(Scalar::value))?;
                    return Some(((velocity / impact_speed).powi(2) / f64::EPSILON, quantity));
                }
                _ => return None,
            };
            let scale = if quantity.is_over_impact_speed() { impact_speed } else { exact.value() };
            let error = (TwoFloat::from(value) - exact).value().abs();
            let units = if error == 0.0 { 0.0 } else { error / scale.abs() / f64::EPSILON };
            Some((units, quantity))
        };
        Self(Quantity::OF_A_FLIGHT.into_iter().filter_map(error).collect())
    }

    /// Of `flight` against 50 digits with the same outcome, in units of round-off over max(1, condition number).
    ///
    /// The crater's end that only one of them lists counts with W/V0² there, whose sign decides the event. Beyond
    /// [`TIE`] that is no rounding: the error is NaN.
    pub fn in_50_digits(flight: &Flight, exact: &ExactFlight, conditions: &Conditions) -> Self {
        let mut errors = Vec::with_capacity(5);
        for quantity in Quantity::OF_A_FLIGHT {
            let end = if quantity.is_at_crater_end() { exact.crater_end() } else { Some(&exact.end) };
            let condition = condition_of(conditions, quantity);
            let error = match (value_of(quantity, flight), end, quantity) {
                (Some(value), Some(end), Quantity::Depth) => end.depth.relative_error(value),
                (Some(value), Some(end), Quantity::Time | Quantity::CraterEndTime) => end.time.relative_error(value),
                (Some(value), Some(end), _) => end.velocity.error_over(value, &exact.impact_speed),
                (value, end, Quantity::CraterEndVelocity) if value.is_some() || end.is_some() => {
                    let velocity = value.map(|v| v / exact.impact_speed.to_f64());
                    let velocity = velocity.or(end.map(|end| end.velocity.error_over(0.0, &exact.impact_speed)));
                    let w = velocity.map_or(f64::NAN, |velocity| velocity * velocity);
                    if w / f64::EPSILON / condition <= TIE { w } else { f64::NAN }
                }
                _ => continue,
            };
            errors.push((error.abs() / f64::EPSILON / condition, quantity));
        }
        Self(errors)
    }

    /// The same over max(1, condition number).
    #[must_use]
    pub fn over(mut self, conditions: &Conditions) -> Self {
        for (error, quantity) in &mut self.0 {
            *error /= condition_of(conditions, *quantity);
        }
        self
    }

    /// The largest; a NaN is the largest of all.
    pub fn worst(&self) -> Option<(f64, Quantity)> {
        self.0.iter().copied().max_by(|a, b| compare(a.0, b.0))
    }

    /// Whether one of them is beyond `limit`.
    pub fn exceed(&self, limit: f64) -> bool {
        self.0.iter().any(|(error, _)| exceeds(*error, limit))
    }
}

/// Condition number of `quantity`, at least one; one for what no flight has.
pub fn condition_of(conditions: &Conditions, quantity: Quantity) -> f64 {
    conditions.get(quantity as usize).map_or(1.0, |condition| condition.max(1.0))
}

/// Condition numbers of `problem` by dual numbers: one flight for each input that is not zero. As
/// [`crate::physics::reference::conditions`], and far cheaper.
///
/// # Errors
/// As [`Taylor::solve_in`].
pub fn conditions_in_dual_numbers(problem: &Problem) -> Result<Conditions, IntegrationError> {
    let mut sums = Conditions::default();
    let mut add = |input: &dyn Fn(&mut Problem<Dual64>) -> &mut Dual64| -> Result<(), IntegrationError> {
        let mut dual = problem.cast::<Dual64>();
        let number = input(&mut dual);
        // df/dp times p: the derivative by the input starts as its value.
        number.eps = number.re;
        // Where a stage has a law of its own, its coefficients are no numbers.
        if number.re == 0.0 || !number.re.is_finite() {
            return Ok(());
        }
        let flight = Taylor::default().solve_in(&dual, Detail::Events)?;
        for (sum, quantity) in sums.iter_mut().zip(Quantity::OF_A_FLIGHT) {
            let Some(Dual64 { re, eps, .. }) = value_of(quantity, &flight) else { continue };
            let scale = if quantity.is_over_impact_speed() { problem.impact_speed } else { re };
            *sum += if scale == 0.0 { 0.0 } else { (eps / scale).abs() };
        }
        Ok(())
    };
    add(&|p| &mut p.mass)?;
    add(&|p| &mut p.impact_speed)?;
    add(&|p| &mut p.exit_depth)?;
    for index in 0..problem.stages.len() {
        add(&|p| &mut p.stages[index].static_force)?;
        add(&|p| &mut p.stages[index].stiffness)?;
        add(&|p| &mut p.stages[index].viscosity)?;
        add(&|p| &mut p.stages[index].drag)?;
        add(&|p| &mut p.stages[index].end)?;
    }
    Ok(sums)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::physics::reference::{self, Source};
    use crate::physics::{Event, EventKind, Stage};
    use crate::testing::scene;

    #[test]
    fn a_crater_end_that_is_not_listed_is_no_rounding_and_at_rest_it_may_be() {
        let problem = scene().problem().unwrap();
        let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events).unwrap();
        let mut flight = Taylor::default().solve(&problem, Detail::Events).unwrap();
        assert!(!Errors::in_double_double(&flight, &exact, problem.impact_speed).exceed(TIE));
        flight.events.clear();
        // W is most of V0² there.
        let (units, quantity) = Errors::in_double_double(&flight, &exact, problem.impact_speed).worst().unwrap();
        assert!(units * f64::EPSILON > 0.5 && quantity == Quantity::CraterEndVelocity, "{units}");
        let source = Source::Problem(&problem);
        let (exact, conditions) = (reference::flight(source).unwrap(), reference::conditions(source).unwrap());
        assert!(Errors::in_50_digits(&flight, &exact, &conditions).worst().unwrap().0.is_nan());
        // Rest in the crater, a rounding before its end: whether that is passed nobody can say.
        let slow = scene().resolve(1.0).unwrap();
        let source = Source::Problem(&slow);
        let (exact, conditions) = (reference::flight(source).unwrap(), reference::conditions(source).unwrap());
        let mut touching = Taylor::default().solve(&slow, Detail::Events).unwrap();
        let state = State { velocity: 1e-9, ..touching.end };
        touching.events.insert(0, Event { kind: EventKind::CraterEnd, state });
        assert!(!Errors::in_50_digits(&touching, &exact, &conditions).exceed(TIE));
    }

    /// Beside differences of flights at 50 digits, which move every input by 2^-80.
    #[test]
    fn condition_numbers_in_dual_numbers_are_those_of_50_digits() {
        let near = Stage { static_force: 2e5, stiffness: 4e6, viscosity: 300.0, drag: 0.0, end: 0.05 };
        let far = Stage { static_force: 4e5, stiffness: 1e5, viscosity: 900.0, drag: 0.0, end: f64::INFINITY };
        for exit in [f64::INFINITY, 0.12] {
            let problem = Problem::of_stages(2.0, 300.0, [near, far]).with_exit(exit);
            let ours = conditions_in_dual_numbers(&problem).unwrap();
            let theirs = reference::conditions(Source::Problem(&problem)).unwrap();
            for (ours, theirs) in ours.into_iter().zip(theirs) {
                assert!((ours - theirs).abs() <= 1e-9 * theirs, "{ours} {theirs}");
            }
        }
    }
}
