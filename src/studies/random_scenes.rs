//! Random scenes from a seed, and how the closed form fares on a scene.

use thiserror::Error;

use super::quantity::Quantity;
use super::random::Random;
use crate::integrators::{ClosedForm, Detail, Flight, IntegrationError, Integrator};
use crate::physics::closed_form::{CraterAndTunnel, solve_crater_and_tunnel};
use crate::physics::reference::{self, Conditions, ExactFlight, ReferenceError, Source};
use crate::physics::{Concrete, CraterStiffness, Outcome, Problem, ResolveError, Scene, groups};

/// Draws scenes that cover the groups log-uniformly.
///
/// I from 1e-3 to 1e3, N from 0.1 to 1e6 or Q = 0, H/d from 0.1 to 30 or none, k from 0.1 to 10, d from 1 mm to 1 m,
/// c continuous or given within a factor 4 of it.
#[derive(Clone, Debug)]
pub struct Generator {
    random: Random,
}

impl Generator {
    /// The scenes of part `name` of a study with `seed`.
    pub fn new(seed: u64, name: &str) -> Self {
        Self { random: Random::for_part(seed, name) }
    }

    /// The next scene, with an impact velocity.
    pub fn next_scene(&mut self) -> Scene {
        let random = &mut self.random;
        let mut concrete = Concrete {
            diameter: random.log_uniform(1e-3, 1.0),
            nose_factor: random.log_uniform(0.05, 1.0),
            strength: random.log_uniform(10e6, 150e6),
            density: 0.0,
            static_factor: random.log_uniform(4.0, 25.0),
            inertia_factor: 1.0,
            crater_ratio: random.log_uniform(0.1, 10.0),
            crater_stiffness: CraterStiffness::Continuous,
            layers: Vec::new(),
        };
        let mass = random.log_uniform(1e-3, 1e3);
        if !random.chance(0.1) {
            let geometry = random.log_uniform(0.1, 1e6);
            concrete.density = groups::density_for(geometry, mass, &concrete);
        }
        let velocity = groups::impact_speed_for(random.log_uniform(1e-3, 1e3), mass, &concrete);
        let thickness = (!random.chance(0.3)).then(|| concrete.diameter * random.log_uniform(0.1, 30.0));
        if random.chance(0.3) {
            let area = std::f64::consts::FRAC_PI_4 * concrete.diameter * concrete.diameter;
            let about = area * concrete.static_factor * concrete.strength / (concrete.crater_ratio * concrete.diameter);
            concrete.crater_stiffness = CraterStiffness::Given(about * random.log_uniform(0.25, 4.0));
        }
        Scene { thickness, velocity: Some(velocity), ..Scene::of_concrete(mass, concrete) }
    }
}

/// Errors of a flight in ulp over max(1, condition number), per quantity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UlpErrors(pub Vec<(f64, Quantity)>);

impl UlpErrors {
    /// The largest; a NaN is the largest of all.
    pub fn worst(&self) -> Option<(f64, Quantity)> {
        self.0.iter().copied().max_by(|a, b| match (a.0.is_nan(), b.0.is_nan()) {
            (true, false) => std::cmp::Ordering::Greater,
            (false, true) => std::cmp::Ordering::Less,
            _ => a.0.total_cmp(&b.0),
        })
    }
}

/// Condition number of `quantity`; `None` where the flight does not have it.
pub fn condition_of(conditions: &Conditions, quantity: Quantity) -> Option<f64> {
    match quantity {
        Quantity::Depth => Some(conditions.depth),
        Quantity::Time => Some(conditions.time),
        Quantity::Velocity => Some(conditions.velocity),
        Quantity::CraterEndTime => conditions.crater_end_time,
        Quantity::CraterEndVelocity => conditions.crater_end_velocity,
        Quantity::CriticalVelocity => None,
    }
}

/// Why a scene has no comparison.
#[derive(Clone, Debug, Error)]
pub enum ComparisonError {
    /// It does not resolve.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// It has no closed form.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// It has no reference.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The outcomes differ, and not within the error bar.
    #[error("the closed form says {found}, the reference {exact}")]
    Outcome {
        /// Outcome found.
        found: String,
        /// Outcome of the reference.
        exact: String,
    },
}

/// The closed form of `scene`, of its stages and of its numbers, against 50 digits of its numbers, in ulp over max(1,
/// condition number).
///
/// The stages hold a continuous crater constant rounded to f64, which alone moves V1 by up to
/// `sqrt(1 + k d Q/M)/4` ulp of V0: for k/N far above 100 only [`closed_form_errors_at_inputs`] tells rounding from fault.
///
/// # Errors
/// [`ComparisonError`].
pub fn closed_form_errors(scene: &Scene) -> Result<UlpErrors, ComparisonError> {
    let problem = scene.problem()?;
    let flight = ClosedForm.fly(&problem, Detail::Events)?;
    let mut errors = errors_of(Source::Scene(scene, problem.impact_speed), &flight)?;
    errors.0.extend(errors_of_numbers(scene, &problem, flight)?.0);
    Ok(errors)
}

/// As [`closed_form_errors`], the closed form of the stages against 50 digits of the same stages.
///
/// # Errors
/// [`ComparisonError`].
pub fn closed_form_errors_at_inputs(scene: &Scene) -> Result<UlpErrors, ComparisonError> {
    let problem = scene.problem()?;
    let flight = ClosedForm.fly(&problem, Detail::Events)?;
    let mut errors = errors_of(Source::Problem(&problem), &flight)?;
    errors.0.extend(errors_of_numbers(scene, &problem, flight)?.0);
    Ok(errors)
}

/// The closed form from the numbers of the model, where `scene` is one crater and one tunnel; `flight` is overwritten.
fn errors_of_numbers(scene: &Scene, problem: &Problem, mut flight: Flight) -> Result<UlpErrors, ComparisonError> {
    let plain = scene.concrete().filter(|concrete| concrete.layers.is_empty());
    let (Some(concrete), Some(static_force), Some(drag)) = (plain, scene.static_force(), scene.drag()) else {
        return Ok(UlpErrors::default());
    };
    let model = CraterAndTunnel {
        mass: scene.mass,
        crater_depth: concrete.crater_depth(),
        static_force,
        drag,
        crater_stiffness: concrete.crater_stiffness,
    };
    let solution =
        solve_crater_and_tunnel(&model, problem.impact_speed, problem.exit_depth).map_err(IntegrationError::from)?;
    (flight.outcome, flight.end, flight.events) = (solution.outcome, solution.end, solution.events);
    errors_of(Source::Scene(scene, problem.impact_speed), &flight)
}

/// `flight` against 50 digits of `source`, in ulp over max(1, condition number).
///
/// An undecided flight has no errors.
///
/// # Errors
/// [`ComparisonError`].
pub fn errors_of(source: Source<'_>, flight: &Flight) -> Result<UlpErrors, ComparisonError> {
    let exact = reference::flight(source)?;
    if flight.outcome == Outcome::Undecided {
        return Ok(UlpErrors::default());
    }
    compared(flight, &exact)?;
    Ok(errors_beside(flight, &exact, &reference::conditions(source)?))
}

/// Refuses a flight with another outcome than the exact one.
///
/// # Errors
/// [`ComparisonError::Outcome`].
pub fn compared(flight: &Flight, exact: &ExactFlight) -> Result<(), ComparisonError> {
    if flight.outcome.agrees_with(exact.outcome) {
        return Ok(());
    }
    Err(ComparisonError::Outcome { found: flight.outcome.to_string(), exact: exact.outcome.to_string() })
}

/// `flight` against `exact`, which has the same outcome, in ulp over max(1, condition number).
pub fn errors_beside(flight: &Flight, exact: &ExactFlight, conditions: &Conditions) -> UlpErrors {
    let mut errors = Vec::new();
    let mut add = |error: f64, condition: f64, quantity| {
        errors.push((error.abs() / f64::EPSILON / fault!("condition-left-out", condition.max(1.0), 1.0), quantity));
    };
    add(exact.end.depth.relative_error(flight.end.depth), conditions.depth, Quantity::Depth);
    add(exact.end.time.relative_error(flight.end.time), conditions.time, Quantity::Time);
    add(
        exact.end.velocity.error_over(flight.end.velocity, &exact.impact_speed),
        conditions.velocity,
        Quantity::Velocity,
    );
    if flight.crater_end().is_some() != exact.crater_end().is_some() {
        // One lacks an event that the other has: no number of ulps.
        errors.push((f64::NAN, Quantity::CraterEndTime));
    } else if let (Some(found), Some(end)) = (flight.crater_end(), exact.crater_end()) {
        let (time, velocity) =
            (conditions.crater_end_time.unwrap_or(1.0), conditions.crater_end_velocity.unwrap_or(1.0));
        add(end.time.relative_error(found.time), time, Quantity::CraterEndTime);
        add(end.velocity.error_over(found.velocity, &exact.impact_speed), velocity, Quantity::CraterEndVelocity);
    }
    UlpErrors(errors)
}
