//! Random scenes from a seed, and how the closed form fares on a scene.

use super::error::{Errors, Studied, StudyError};
use super::random::Random;
use crate::integrators::closed_form::solve_crater_and_tunnel;
use crate::integrators::{ClosedForm, Detail, Flight, Integrator};
use crate::physics::reference::{self, Source};
use crate::physics::{Concrete, CraterStiffness, Outcome, Problem, Scene, groups};

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
            follows_eq14: false,
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

/// The closed form of `scene`, of its stages and of its numbers, against 50 digits of its numbers, in ulp over max(1,
/// condition number).
///
/// The stages hold a continuous crater constant rounded to f64, which alone moves V1 by up to
/// `sqrt(1 + k d Q/M)/4` ulp of V0: for k/N far above 100 only [`closed_form_errors_at_inputs`] distinguishes rounding from a fault.
///
/// # Errors
/// [`StudyError`].
pub fn closed_form_errors(scene: &Scene) -> Studied<Errors> {
    let problem = scene.problem()?;
    errors_of_both_forms(scene, &problem, Source::Scene(scene, problem.impact_speed))
}

/// As [`closed_form_errors`], the closed form of the stages against 50 digits of the same stages.
///
/// # Errors
/// [`StudyError`].
pub fn closed_form_errors_at_inputs(scene: &Scene) -> Studied<Errors> {
    let problem = scene.problem()?;
    errors_of_both_forms(scene, &problem, Source::Problem(&problem))
}

/// The closed form of the stages against `source`, and for one crater and one tunnel, with the speed in the crater
/// computed without c, against the scene.
fn errors_of_both_forms(scene: &Scene, problem: &Problem, source: Source<'_>) -> Studied<Errors> {
    let mut errors = errors_of(source, &ClosedForm.solve(problem, Detail::Events)?)?;
    if let Some(concrete) = scene.concrete().filter(|concrete| concrete.layers.is_empty()) {
        let flight = solve_crater_and_tunnel(problem, concrete.crater_stiffness)?;
        errors.0.extend(errors_of(Source::Scene(scene, problem.impact_speed), &flight)?.0);
    }
    Ok(errors)
}

/// `flight` against 50 digits of `source`, in ulp over max(1, condition number).
///
/// An undecided flight has no errors.
///
/// # Errors
/// [`StudyError`].
pub fn errors_of(source: Source<'_>, flight: &Flight) -> Studied<Errors> {
    let exact = reference::flight(source)?;
    if flight.outcome == Outcome::Undecided {
        return Ok(Errors::default());
    }
    if !flight.outcome.agrees_with(exact.outcome) {
        return Err(StudyError::Outcome { found: flight.outcome, exact: exact.outcome });
    }
    Ok(Errors::in_50_digits(flight, &exact, &reference::conditions(source)?))
}
