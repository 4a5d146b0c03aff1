//! How fast do a method's answers converge, quantity by quantity?
//!
//! Fixed steps: the error over many step sizes with random ratios. Adaptive methods: the error over the tolerance
//! (slope 1 is proportional) and over 1/evaluations (slope is the order). The fit and its verdict are
//! [`super::order`]; what order to expect is [`super::formal_order`].

use thiserror::Error;

use super::critical_velocity::{self, CriticalError};
use super::error::{flight_error, is_fixed, signed_error};
use super::formal_order::{Path, formal_order};
use super::order::{FitError, OrderFit, StepError, fit};
use super::quantity::Quantity;
use super::random::Random;
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, IntegrationError, Steps, VelocityAt};
use crate::physics::{Problem, ResolveError, Scene};

/// Fewest sizes of a study, so that single unlucky ones do not decide.
pub const POINTS_DEFAULT: u16 = 60;

/// Smallest and largest step of a study over the time of the flight.
pub const STEPS_OVER_TIME: [f64; 2] = [1e-5, 1e-2];

/// Tolerances of a study of an adaptive method.
pub const TOLERANCES: [f64; 2] = [1e-11, 1e-4];

/// Steps or tolerances: how many, between which bounds, from which seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    /// Smallest.
    pub from: f64,
    /// Largest.
    pub to: f64,
    /// How many.
    pub points: usize,
    /// Seed.
    pub seed: u64,
}

impl Ladder {
    /// The sizes, descending, log-uniform with random ratios; both bounds are among them.
    pub fn sizes(&self) -> Vec<f64> {
        let mut random = Random::for_part(self.seed, "ladder");
        let mut sizes: Vec<f64> =
            (0..self.points.saturating_sub(2)).map(|_| random.log_uniform(self.from, self.to)).collect();
        sizes.extend([self.from, self.to]);
        sizes.sort_by(|a, b| b.total_cmp(a));
        sizes
    }
}

/// The convergence of one quantity.
#[derive(Clone, Debug)]
pub struct QuantityStudy {
    /// Which.
    pub quantity: Quantity,
    /// Order expected.
    pub formal: Option<f64>,
    /// Error over the step or the tolerance.
    pub fit: Result<OrderFit, FitError>,
    /// Error over 1/evaluations, for methods of one order.
    pub work: Option<Result<OrderFit, FitError>>,
    /// Evaluations at each point of `fit`, in the order of ascending steps, for adaptive methods.
    pub evaluations: Vec<u64>,
    /// Sizes at which there was no error to measure, because the outcome was not the exact one.
    pub lost: usize,
}

/// Why there is no study.
#[derive(Clone, Debug, Error)]
pub enum ConvergenceError {
    /// The scene does not resolve.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// A flight has no answer.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// A critical velocity has no answer.
    #[error(transparent)]
    Critical(#[from] CriticalError<ResolveError>),
}

/// The exact flight of a problem, or a refined one where no closed form exists.
#[derive(Clone, Debug)]
pub struct Yardstick {
    /// The flight.
    pub flight: Flight,
    /// Whether it is the closed form.
    pub is_closed_form: bool,
}

impl Yardstick {
    /// The closed form, else the Taylor series to round-off.
    ///
    /// # Errors
    /// When neither has an answer.
    pub fn of(problem: &Problem) -> Result<Self, IntegrationError> {
        use crate::integrators::{ClosedForm, Integrator, Taylor};
        match ClosedForm.fly(problem, Detail::Events) {
            Ok(flight) => Ok(Self { flight, is_closed_form: true }),
            Err(_) => Ok(Self { flight: Taylor::default().fly(problem, Detail::Events)?, is_closed_form: false }),
        }
    }
}

/// Convergence of the central difference with the step, for every quantity that the scene leaves free.
///
/// `steps_of` turns a step size into the steps of one run (all equal, alternating ...). The critical velocity is
/// studied where `with_critical` asks for it and the scene has a thickness.
///
/// # Errors
/// [`ConvergenceError`].
pub fn of_fixed_steps(
    scene: &Scene,
    problem: &Problem,
    (velocity, boundaries): (VelocityAt, Boundaries),
    ladder: Ladder,
    with_critical: bool,
    steps_of: &(dyn Fn(f64) -> Steps + Sync),
) -> Result<Vec<QuantityStudy>, ConvergenceError> {
    let exact = Yardstick::of(problem)?.flight;
    let path = Path::of(problem, &exact);
    let sizes = ladder.sizes();
    let scheme = |size: f64| CentralDifference {
        steps: steps_of(size),
        ..CentralDifference::uniform(size, velocity, boundaries)
    };
    let flights = sizes
        .iter()
        .map(|&size| scheme(size).fly_in(problem, Detail::Events).map(|flight| (size, flight)))
        .collect::<Result<Vec<_>, _>>()?;
    let mut studies = Vec::new();
    for quantity in Quantity::ALL {
        if quantity == Quantity::CriticalVelocity || is_fixed(quantity, &exact) {
            continue;
        }
        let points: Vec<StepError> = flights
            .iter()
            .filter_map(|(size, flight)| {
                flight_error(quantity, flight, &exact, problem.impact_speed).map(|e| StepError::new(*size, e))
            })
            .collect();
        studies.push(QuantityStudy {
            quantity,
            formal: formal_order(velocity, boundaries, &path, quantity),
            lost: sizes.len() - points.len(),
            fit: fit(&points),
            work: None,
            evaluations: Vec::new(),
        });
    }
    if with_critical && problem.has_exit() {
        let exact_critical = critical_velocity::exact_or_refined(scene)?;
        if exact_critical == 0.0 {
            // Nothing to be relative to; see `why_no_critical_velocity`.
            return Ok(studies);
        }
        let critical_flight = Yardstick::of(&scene.resolve(exact_critical)?)?.flight;
        let path = Path::of(&scene.resolve(exact_critical)?, &critical_flight);
        let mut points = Vec::new();
        for &size in &sizes {
            let found = critical_velocity::of_scene(scene, &scheme(size))?;
            let error = signed_error(Quantity::CriticalVelocity, found.velocity, exact_critical, 1.0);
            points.push(StepError::new(size, error));
        }
        studies.push(QuantityStudy {
            quantity: Quantity::CriticalVelocity,
            formal: formal_order(velocity, boundaries, &path, Quantity::CriticalVelocity),
            lost: 0,
            fit: fit(&points),
            work: None,
            evaluations: Vec::new(),
        });
    }
    Ok(studies)
}

/// Why the critical velocity of `scene` has no order to study, where the target has a far side and it still has none.
///
/// # Errors
/// As the search for it.
pub fn why_no_critical_velocity(scene: &Scene) -> Result<Option<&'static str>, ConvergenceError> {
    if scene.thickness.is_none() {
        return Ok(None);
    }
    let is_zero = critical_velocity::exact_or_refined(scene)? == 0.0;
    Ok(is_zero.then_some("it is 0: the target is perforated at any speed, and an error relative to it means nothing"))
}

/// Convergence of an adaptive method with its tolerance and with its work.
///
/// # Errors
/// [`ConvergenceError`].
pub fn of_tolerances(
    problem: &Problem,
    method: MethodName,
    ladder: Ladder,
) -> Result<Vec<QuantityStudy>, ConvergenceError> {
    let exact = Yardstick::of(problem)?.flight;
    let mut flights = Vec::new();
    let mut order = None;
    for rtol in ladder.sizes() {
        let method = Method::new(method, &MethodOptions { rtol: Some(rtol), ..MethodOptions::default() })?;
        order = method.integrator().order();
        flights.push((rtol, method.integrator().fly(problem, Detail::Events)?));
    }
    let mut studies = Vec::new();
    for quantity in Quantity::ALL {
        if quantity == Quantity::CriticalVelocity || is_fixed(quantity, &exact) {
            continue;
        }
        let mut measured: Vec<(f64, u64, f64)> = flights
            .iter()
            .filter_map(|(rtol, flight)| {
                flight_error(quantity, flight, &exact, problem.impact_speed)
                    .map(|e| (*rtol, flight.cost.force_evaluations, e))
            })
            .collect();
        measured.sort_by(|a, b| a.0.total_cmp(&b.0));
        let over_tolerance: Vec<_> = measured.iter().map(|&(rtol, _, e)| StepError::new(rtol, e)).collect();
        let over_work: Vec<_> = measured.iter().map(|&(_, n, e)| StepError::new(1.0 / n.max(1) as f64, e)).collect();
        studies.push(QuantityStudy {
            quantity,
            formal: Some(1.0),
            lost: flights.len() - measured.len(),
            fit: fit(&over_tolerance),
            work: order.map(|_| fit(&over_work)),
            evaluations: measured.iter().map(|&(_, n, _)| n).collect(),
        });
    }
    Ok(studies)
}
