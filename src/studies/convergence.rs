//! How fast do a method's answers converge, quantity by quantity?
//!
//! Fixed steps: the error over many step sizes with random ratios. Adaptive methods: the error over the tolerance
//! (slope 1 is proportional) and over 1/evaluations (slope is the order). The fit and its verdict are
//! [`super::order`]; what order to expect is [`super::formal_order`](mod@super::formal_order).

use super::critical_velocity;
use super::error::{Studied, Truth, flight_error, free_quantities, signed_error};
use super::formal_order::{Path, formal_order};
use super::order::{Class, FitError, OrderFit, StepError, fit};
use super::quantity::Quantity;
use super::random::Random;
use super::verdict::Verdict;
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{CentralDifference, Detail, Flight};
use crate::physics::{Problem, Scene};

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

impl QuantityStudy {
    /// Whether the fit confirms the order expected.
    ///
    /// Over tolerances the class decides: a controller holds the error of a step, not of the flight.
    pub fn verdict(&self) -> Verdict {
        match (&self.fit, self.formal) {
            (Ok(fit), _) if !self.evaluations.is_empty() && fit.class == Class::Converging => Verdict::Passed,
            (Ok(fit), Some(formal)) => fit.verdict(formal),
            _ => Verdict::Undecided,
        }
    }
}

/// Studies of the quantities of one scene.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// One of each free quantity.
    pub quantities: Vec<QuantityStudy>,
    /// Why the critical velocity is not among them, where it was asked for and the target has a far side.
    pub no_critical_velocity: Option<&'static str>,
}

/// Convergence of the central difference with the step, for every quantity that `exact` leaves free.
///
/// `scheme` is the scheme of one step size: its steps may be equal, alternating and so on. The critical velocity is
/// studied where `with_critical` asks for it and the scene has a thickness.
///
/// # Errors
/// [`StudyError`](super::error::StudyError).
pub fn of_fixed_steps(
    scene: &Scene,
    problem: &Problem,
    exact: &Flight,
    scheme: &dyn Fn(f64) -> CentralDifference,
    ladder: Ladder,
    with_critical: bool,
) -> Studied<Convergence> {
    let sizes = ladder.sizes();
    let CentralDifference { velocity, boundaries, .. } = scheme(ladder.to);
    let study = |quantity, path: &Path, points: &[StepError]| QuantityStudy {
        quantity,
        formal: formal_order(velocity, boundaries, path, quantity),
        lost: sizes.len() - points.len(),
        fit: fit(points),
        work: None,
        evaluations: Vec::new(),
    };
    let flights = sizes
        .iter()
        .map(|&size| scheme(size).solve_in(problem, Detail::Events).map(|flight| (size, flight)))
        .collect::<Result<Vec<_>, _>>()?;
    let path = Path::of(problem, exact);
    let mut found = Convergence { quantities: Vec::new(), no_critical_velocity: None };
    for quantity in free_quantities(exact) {
        let error = |flight| flight_error(quantity, flight, exact, problem.impact_speed);
        let points: Vec<StepError> =
            flights.iter().filter_map(|(size, flight)| Some(StepError::new(*size, error(flight)?))).collect();
        found.quantities.push(study(quantity, &path, &points));
    }
    if !(with_critical && problem.has_exit()) {
        return Ok(found);
    }
    let quantity = Quantity::CriticalVelocity;
    let exact = critical_velocity::exact_or_refined(scene)?;
    if exact == 0.0 {
        let why = "it is 0: the target is perforated at any speed, and an error relative to it means nothing";
        found.no_critical_velocity = Some(why);
        return Ok(found);
    }
    let critical = scene.resolve(exact)?;
    let path = Path::of(&critical, &Truth::of(&critical)?.flight);
    let error = |size| -> Studied<StepError> {
        let velocity = critical_velocity::of_scene(scene, &scheme(size))?.velocity;
        Ok(StepError::new(size, signed_error(quantity, velocity, exact, 1.0)))
    };
    let points = sizes.iter().map(|&size| error(size)).collect::<Result<Vec<_>, _>>()?;
    found.quantities.push(study(quantity, &path, &points));
    Ok(found)
}

/// Convergence of an adaptive method with its tolerance and with its work, against `exact`.
///
/// # Errors
/// [`StudyError`](super::error::StudyError).
pub fn of_tolerances(problem: &Problem, exact: &Flight, method: MethodName, ladder: Ladder) -> Studied<Convergence> {
    let mut flights = Vec::new();
    let mut order = None;
    for rtol in ladder.sizes() {
        let method = Method::new(method, &MethodOptions { rtol: Some(rtol), ..MethodOptions::default() })?;
        order = method.integrator().order();
        flights.push((rtol, method.integrator().solve(problem, Detail::Events)?));
    }
    // Ascending, as a fit lists its points.
    flights.reverse();
    let study = |quantity| {
        let measured: Vec<(f64, u64, f64)> = flights
            .iter()
            .filter_map(|(rtol, flight)| {
                let error = flight_error(quantity, flight, exact, problem.impact_speed)?;
                Some((*rtol, flight.cost.force_evaluations, error))
            })
            .collect();
        let over_tolerance: Vec<_> = measured.iter().map(|&(rtol, _, e)| StepError::new(rtol, e)).collect();
        let over_work: Vec<_> = measured.iter().map(|&(_, n, e)| StepError::new(1.0 / n.max(1) as f64, e)).collect();
        QuantityStudy {
            quantity,
            formal: Some(1.0),
            lost: flights.len() - measured.len(),
            fit: fit(&over_tolerance),
            work: order.map(|_| fit(&over_work)),
            evaluations: measured.iter().map(|&(_, n, _)| n).collect(),
        }
    };
    Ok(Convergence { quantities: free_quantities(exact).map(study).collect(), no_critical_velocity: None })
}
