//! How do depth, residual velocity and critical velocity answer to every number of a scene, and how sure is V_c then?
//!
//! Derivatives come by dual numbers, twice and by two roads that share nothing but the scene:
//!
//! - **closed form**: W = V² is carried over depth by its exact formula ([`crate::physics::exit_energy`]), here in dual
//!   numbers, and what is asked for is implicit in it:
//!
//!   ```text
//!   W(X; p) = 0    dX/dp   = (M/2F(X)) dW/dp      rest
//!   V_r² = W(H; p) dV_r/dp = (dW/dp)/(2 V_r)      perforation, H moving with p
//!   W(H; V_c, p) = 0  dV_c/dp = -(dW/dp)/(dW/dV0)
//!   ```
//!
//! - **Taylor**: the integrator itself flies in dual numbers, over time, its events moving with the parameter. Its V_c
//!   is the speed at which the rest depth of the target, continued beyond H, is H.
//!
//! A strength that S follows by Eq. 14 carries the derivative of S with it, as in a sweep; S itself is listed too, for
//! the uncertainty of Eq. 14.

use std::f64::consts::FRAC_PI_4;

use num_dual::{Dual64, DualNum};
use rayon::prelude::*;
use thiserror::Error;

use super::critical_velocity;
use super::parameter::{LayerNumber, Parameter, ParameterError, StageNumber};
use super::random::Random;
use crate::integrators::{ClosedForm, Detail, Energy, IntegrationError, Integrator, Taylor};
#[cfg(feature = "diffsol")]
use crate::physics::EventKind;
use crate::physics::{
    Concrete, CraterStiffness, Criterion, Outcome, Problem, Resistance, ResolveError, Scalar, Scene, Stage, Stages,
    State, semi_empirical,
};

/// Derivatives with respect to one number of the scene; `None` where there is no such quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensitivity {
    /// The number.
    pub parameter: Parameter,
    /// Its value, SI.
    pub value: f64,
    /// dX/dp of a stop.
    pub depth: Option<f64>,
    /// dV_r/dp of a perforation.
    pub velocity: Option<f64>,
    /// dV_c/dp of a target with a far side.
    pub critical_velocity: Option<f64>,
}

/// The quantities themselves, at the scene's own numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantities {
    /// Depth at rest X [m].
    pub depth: Option<f64>,
    /// Residual velocity V_r [m/s].
    pub velocity: Option<f64>,
    /// Critical velocity V_c [m/s].
    pub critical_velocity: Option<f64>,
}

/// Quantities and their derivatives, by one road.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivities {
    /// The quantities.
    pub quantities: Quantities,
    /// One entry for each number of the scene, in the order of [`Parameter`].
    pub entries: Vec<Sensitivity>,
    /// What was not computed, and why.
    pub notes: Vec<String>,
}

/// Elasticity `d ln y/d ln p` of a derivative `dy/dp`; `None` where y is zero.
pub fn elasticity(derivative: Option<f64>, quantity: Option<f64>, value: f64) -> Option<f64> {
    let (derivative, quantity) = (derivative?, quantity?);
    (quantity != 0.0).then(|| derivative * value / quantity)
}

/// Why there are no sensitivities.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// The scene does not resolve.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// The flight failed.
    #[error(transparent)]
    Flight(#[from] IntegrationError),
    /// A number of the scene.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No critical velocity to be sure of.
    #[error("there is no critical velocity: {0}")]
    NoCritical(String),
    /// A spread of the impact velocity, in place of which V_c is sought.
    #[error("V_c does not depend on `{}`", Parameter::Velocity)]
    NoInput,
}

/// The problem of `scene` at `speed` [m/s] in any number type; `number` lifts a number of the scene into it.
///
/// The same formulas as [`Scene::resolve`], which has checked the numbers first.
///
/// # Errors
/// As [`Scene::resolve`].
pub fn problem_in<S: Scalar>(
    scene: &Scene,
    speed: f64,
    number: impl Fn(Parameter, f64) -> S,
) -> Result<Problem<S>, ResolveError> {
    let plain = scene.resolve(speed)?;
    let infinite = S::from_f64(f64::INFINITY);
    let mass = number(Parameter::Mass, scene.mass);
    let impact_speed = number(Parameter::Velocity, speed);
    let mut thickness = scene.thickness.map(|h| number(Parameter::Thickness, h));
    let stages: Stages<S> = match &scene.resistance {
        Resistance::Stages(_) => {
            let lift = |index, which, value: f64| number(Parameter::Stage(index, which), value);
            plain
                .stages
                .iter()
                .enumerate()
                .map(|(i, law)| Stage {
                    static_force: lift(i, StageNumber::StaticForce, law.static_force),
                    stiffness: lift(i, StageNumber::Stiffness, law.stiffness),
                    viscosity: lift(i, StageNumber::Viscosity, law.viscosity),
                    drag: lift(i, StageNumber::Drag, law.drag),
                    end: if law.end.is_finite() { lift(i, StageNumber::End, law.end) } else { infinite },
                })
                .collect()
        }
        Resistance::Concrete(concrete) => {
            if !concrete.layers.is_empty() {
                let end_of = |sum: S, (i, layer): (usize, &crate::physics::Layer)| {
                    sum + number(Parameter::Layer(i, LayerNumber::Thickness), layer.thickness)
                };
                let sum = concrete.layers.iter().enumerate().fold(S::zero(), end_of);
                thickness = sum.value().is_finite().then_some(sum);
            }
            concrete_stages(concrete, mass, impact_speed, &plain, &number)
        }
    };
    let exit_depth = match (thickness, scene.criterion) {
        (None, _) => infinite,
        (Some(thickness), Criterion::FullDepth) => thickness,
        (Some(thickness), Criterion::Ndrc) => {
            let d = number(Parameter::Diameter, scene.diameter().ok_or(ResolveError::NoDiameter)?);
            d * perforating_depth_ratio(thickness / d)
        }
    };
    Ok(Problem { mass, impact_speed, exit_depth, stages, crater: plain.crater, target: plain.target })
}

/// [`semi_empirical::perforating_depth_ratio`] in any number type.
fn perforating_depth_ratio<S: Scalar>(h: S) -> S {
    let c = S::from_f64;
    if h.value() <= semi_empirical::NDRC_FIRST_BRANCH_END {
        let a = c(3.19 / (2.0 * 0.718));
        let scaled = h / c(0.718);
        scaled / (a + (a * a - scaled).sqrt())
    } else {
        (h - c(1.32)) / c(1.24)
    }
}

/// Crater and what lies beyond it, in any number type. `plain` is the same in `f64` and says which layers count.
fn concrete_stages<S: Scalar>(
    concrete: &Concrete,
    mass: S,
    speed: S,
    plain: &Problem,
    number: &impl Fn(Parameter, f64) -> S,
) -> Stages<S> {
    let d = number(Parameter::Diameter, concrete.diameter);
    let area = S::from_f64(FRAC_PI_4) * d * d;
    let nose =
        number(Parameter::NoseFactor, concrete.nose_factor) * number(Parameter::InertiaFactor, concrete.inertia_factor);
    // S moves with the strength where it follows Eq. 14, and by itself; its value stays that of the scene.
    let static_factor = |own: S, strength: S| {
        let follows = strength.value() > 0.0 && own.value() == semi_empirical::static_factor(strength.value());
        if !follows {
            return own;
        }
        let by_eq14 = S::from_f64(72.0) / (strength / S::from_f64(1e6)).sqrt();
        own + (by_eq14 - S::from_f64(by_eq14.value()))
    };
    let tunnel = |strength: S, factor: S, density: S, viscosity: S, end: S| Stage {
        static_force: area * static_factor(factor, strength) * strength,
        stiffness: S::zero(),
        viscosity,
        drag: area * nose * density,
        end,
    };
    let infinite = S::from_f64(f64::INFINITY);
    let mut stages = Stages::new();
    if concrete.layers.is_empty() {
        stages.push(tunnel(
            number(Parameter::Strength, concrete.strength),
            number(Parameter::StaticFactor, concrete.static_factor),
            number(Parameter::Density, concrete.density),
            S::zero(),
            infinite,
        ));
    } else {
        let beyond = plain.stages.len() - usize::from(plain.crater.is_some());
        let first = concrete.layers.len() - beyond;
        let mut end = S::zero();
        for (i, layer) in concrete.layers.iter().enumerate() {
            let lift = |which, value| number(Parameter::Layer(i, which), value);
            end += lift(LayerNumber::Thickness, layer.thickness);
            if i >= first {
                stages.push(tunnel(
                    lift(LayerNumber::Strength, layer.strength),
                    lift(LayerNumber::StaticFactor, layer.static_factor),
                    lift(LayerNumber::Density, layer.density),
                    lift(LayerNumber::Viscosity, layer.viscosity),
                    if i + 1 == concrete.layers.len() { infinite } else { end },
                ));
            }
        }
    }
    if plain.crater.is_some() {
        let depth = number(Parameter::CraterRatio, concrete.crater_ratio) * d;
        let stiffness = match concrete.crater_stiffness {
            CraterStiffness::Given(stiffness) => number(Parameter::CraterStiffness, stiffness),
            CraterStiffness::Continuous => {
                let beyond = &stages[0];
                let force = beyond.static_force + beyond.drag * speed * speed;
                force / (S::one() + depth * (beyond.drag / mass)) / depth
            }
        };
        stages.insert(0, Stage::crater(stiffness, depth));
    }
    stages
}

/// The problem with the derivative in `parameter`.
fn dual_problem(scene: &Scene, speed: f64, parameter: Parameter) -> Result<Problem<Dual64>, ResolveError> {
    problem_in(scene, speed, |this, value| Dual64::new(value, if this == parameter { 1.0 } else { 0.0 }))
}

/// `expm1(z)/z` in dual numbers; below |z| = 0.3 by its series, whose derivative keeps its digits.
fn expm1_over(z: Dual64) -> Dual64 {
    if z.re.abs() < 0.3 {
        // sum over n >= 0 of z^n/(n + 1)!, nested; the first neglected term is under 1e-18.
        (1..=14_u32).rev().fold(Dual64::from_re(1.0), |sum, n| z * sum / f64::from(n + 1) + 1.0)
    } else {
        z.exp_m1() / z
    }
}

/// `(y + expm1(-y))/y²` in dual numbers, 1/2 at zero.
fn second_exponential_integral(y: Dual64) -> Dual64 {
    if y.re.abs() < 0.3 {
        (0..15_u32).rev().fold(Dual64::from_re(0.0), |sum, n| (Dual64::from_re(1.0) - y * sum) / f64::from(n + 2))
    } else {
        (y + (-y).exp_m1()) / (y * y)
    }
}

/// W = V² [m²/s²] at `depth`, by the exact formula of each stage before it; `None` past a viscous stage.
fn squared_speed(problem: &Problem<Dual64>, depth: Dual64, last_stage: usize) -> Option<Dual64> {
    let mut w = problem.impact_speed * problem.impact_speed;
    let mut from = Dual64::from_re(0.0);
    for (index, law) in problem.stages.iter().enumerate().take(last_stage + 1) {
        let to = if index == last_stage { depth } else { law.end };
        if law.viscosity.re > 0.0 && to.re > from.re {
            return None;
        }
        let xi = to - from;
        let y = law.drag * xi * 2.0 / problem.mass;
        let steady = (law.static_force + law.stiffness * from) * expm1_over(-y);
        let growing = law.stiffness * xi * second_exponential_integral(y);
        w = w * (-y).exp() - xi * 2.0 / problem.mass * (steady + growing);
        from = to;
    }
    Some(w)
}

/// Index of the stage in which `depth` [m] is reached.
fn stage_at(problem: &Problem, depth: f64) -> usize {
    problem.stages.iter().position(|law| law.end >= depth).unwrap_or(problem.stages.len() - 1)
}

/// Where the flight of `scene` ends, exactly where a closed form exists.
fn located(problem: &Problem) -> Result<crate::integrators::Flight, IntegrationError> {
    ClosedForm.fly(problem, Detail::End).or_else(|_| Taylor::default().fly(problem, Detail::End))
}

/// The impact speed of the scene, or one that resolves it where it gives none.
fn quantities(scene: &Scene, notes: &mut Vec<String>) -> Result<(Quantities, usize), SensitivityError> {
    let mut quantities = Quantities::default();
    let mut stage = 0;
    if let Some(speed) = scene.velocity {
        let flight = located(&scene.resolve(speed)?)?;
        stage = flight.stage;
        match flight.outcome {
            Outcome::Undecided => {
                notes.push("the flight is undecided: X and V_r have no derivative at the critical velocity".to_owned());
            }
            Outcome::Perforated => quantities.velocity = Some(flight.end.velocity),
            _ => quantities.depth = Some(flight.end.depth),
        }
    }
    if scene.thickness.is_some() {
        match critical_velocity::exact_or_refined(scene) {
            Ok(velocity) if velocity > 0.0 => {
                let resists = scene.resolve(velocity)?.stages.iter().all(Stage::resists);
                if resists {
                    quantities.critical_velocity = Some(velocity);
                } else {
                    notes.push("V_c not differentiated: a stage drives, and V_c may stand on a barrier".to_owned());
                }
            }
            Ok(_) => notes.push("V_c not differentiated: it is zero".to_owned()),
            Err(error) => notes.push(format!("V_c not differentiated: {error}")),
        }
    }
    Ok((quantities, stage))
}

/// Sensitivities by the closed form of W over depth.
///
/// A viscous stage has none: its quantities are left out, with a note.
///
/// # Errors
/// [`SensitivityError`]: the scene does not resolve, or its flight has no end.
pub fn by_closed_form(scene: &Scene) -> Result<Sensitivities, SensitivityError> {
    let mut notes = Vec::new();
    let (quantities, stage) = quantities(scene, &mut notes)?;
    let mut entries = Vec::new();
    for parameter in Parameter::all_of(scene) {
        let mut entry = blank(scene, parameter)?;
        // The formula knows no viscosity: at r = 0 it has a value, and no derivative in that direction.
        if parameter.is_viscosity() {
            entries.push(entry);
            continue;
        }
        if let (Some(speed), true) = (scene.velocity, quantities.depth.or(quantities.velocity).is_some()) {
            let problem = dual_problem(scene, speed, parameter)?;
            if let Some(depth) = quantities.depth
                && let Some(w) = squared_speed(&problem, Dual64::from_re(depth), stage)
            {
                let force = problem.stages[stage].values().force(depth, 0.0);
                entry.depth = Some(0.5 * problem.mass.re * w.eps / force);
            }
            if let Some(velocity) = quantities.velocity
                && velocity > 0.0
                && let Some(w) = squared_speed(&problem, problem.exit_depth, stage)
            {
                entry.velocity = Some(0.5 * w.eps / velocity);
            }
        }
        if let Some(critical) = quantities.critical_velocity
            && parameter != Parameter::Velocity
        {
            let with = |parameter| -> Result<Option<f64>, ResolveError> {
                let problem = dual_problem(scene, critical, parameter)?;
                let last = stage_at(&scene.resolve(critical)?, problem.exit_depth.re);
                Ok(squared_speed(&problem, problem.exit_depth, last).map(|w| w.eps))
            };
            if let (Some(moved), Some(faster)) = (with(parameter)?, with(Parameter::Velocity)?) {
                entry.critical_velocity = Some(-moved / faster);
            }
        }
        entries.push(entry);
    }
    Ok(Sensitivities { quantities, entries, notes })
}

/// Sensitivities by the Taylor series in dual numbers.
///
/// # Errors
/// [`SensitivityError`].
pub fn by_taylor(scene: &Scene) -> Result<Sensitivities, SensitivityError> {
    by_flight(scene, |problem| Ok(Taylor::default().fly_in(&with_every_term(problem), Detail::End)?.end))
}

/// `problem` with a small value, 1e-30 of what would be felt, for each coefficient that is zero and has a derivative.
///
/// The series leaves out the terms of a stage that are zero by value, and would lose their derivatives with them. Much
/// smaller values would set its unit of time, where nothing else acts (an air gap), beyond the squares of the numbers.
fn with_every_term(problem: &Problem<Dual64>) -> Problem<Dual64> {
    const UNFELT: f64 = 1e-30;
    let mut problem = problem.clone();
    let places = problem.stages.iter().map(|law| law.end.re).chain([problem.exit_depth.re]);
    let length = places.filter(|place| place.is_finite()).fold(0.0, f64::max);
    let length = if length > 0.0 { length } else { 1.0 };
    let (mass, rate) = (problem.mass.re, problem.impact_speed.re / length);
    for law in &mut problem.stages {
        for (coefficient, felt) in [
            (&mut law.stiffness, mass * rate * rate),
            (&mut law.viscosity, mass * rate),
            (&mut law.drag, mass / length),
        ] {
            if coefficient.re == 0.0 && coefficient.eps != 0.0 {
                coefficient.re = UNFELT * felt;
            }
        }
    }
    problem
}

/// Sensitivities by whatever flies a problem in dual numbers to the state at its end.
fn by_flight(
    scene: &Scene,
    fly: impl Fn(&Problem<Dual64>) -> Result<State<Dual64>, IntegrationError>,
) -> Result<Sensitivities, SensitivityError> {
    let mut notes = Vec::new();
    let (quantities, _) = quantities(scene, &mut notes)?;
    let mut entries = Vec::new();
    for parameter in Parameter::all_of(scene) {
        let mut entry = blank(scene, parameter)?;
        if let (Some(speed), true) = (scene.velocity, quantities.depth.or(quantities.velocity).is_some()) {
            let end = fly(&dual_problem(scene, speed, parameter)?)?;
            entry.depth = quantities.depth.map(|_| end.depth.eps);
            entry.velocity = quantities.velocity.filter(|v| *v > 0.0).map(|_| end.velocity.eps);
        }
        if let Some(critical) = quantities.critical_velocity
            && parameter != Parameter::Velocity
        {
            let rest = |parameter| -> Result<(f64, f64), SensitivityError> {
                let mut problem = dual_problem(scene, critical, parameter)?;
                let exit = problem.exit_depth.eps;
                problem.exit_depth = Dual64::from_re(f64::INFINITY);
                Ok((fly(&problem)?.depth.eps, exit))
            };
            let (deeper, exit) = rest(parameter)?;
            let (faster, _) = rest(Parameter::Velocity)?;
            entry.critical_velocity = Some((exit - deeper) / faster);
        }
        entries.push(entry);
    }
    Ok(Sensitivities { quantities, entries, notes })
}

/// State at the end of `problem`, with its derivative, by the forward sensitivities of the library.
///
/// Stage by stage: `flight` says when each ends, the library integrates state and sensitivities up to that instant at
/// fixed time, and the movement of the event with the parameter is added, `d tau = (d xi_end - d xi)/u`.
#[cfg(feature = "diffsol")]
fn fly_by_diffsol(problem: &Problem<Dual64>, rtol: f64) -> Result<State<Dual64>, IntegrationError> {
    use crate::integrators::diffsol_sensitivity::{LegLaw, fly_leg};
    let plain = problem.cast::<f64>();
    let flight = Taylor::default().fly(&plain, Detail::Events)?;
    let unit_velocity = plain.impact_speed;
    let mut entry = State::at_impact(problem);
    for event in &flight.events {
        // At one place several events may stand; only the first is a leg.
        let elapsed = event.state.time - entry.time.re;
        // The law does not ask for the time: of it only the value is kept.
        let time = Dual64::from_re(event.state.time);
        let stage = match event.kind {
            EventKind::StageEnd(index) => index,
            EventKind::CraterEnd => problem.crater.unwrap_or(0),
            EventKind::Exit | EventKind::Rest => flight.stage,
        };
        if elapsed <= 0.0 {
            continue;
        }
        let law = &problem.stages[stage];
        let unit_depth = unit_velocity * elapsed;
        let (force, way) = (problem.mass * unit_velocity * unit_velocity, unit_depth);
        let leg = LegLaw {
            steady: (law.static_force + law.stiffness * entry.depth) * way / force,
            growing: law.stiffness * way * way / force,
            viscosity: law.viscosity * way / (problem.mass * unit_velocity),
            drag: law.drag * way / problem.mass,
            velocity: entry.velocity / unit_velocity,
        };
        let moved = [leg.steady, leg.growing, leg.viscosity, leg.drag, leg.velocity];
        let [steady, growing, viscosity, drag, velocity] = moved.map(|number| number.re);
        let end = fly_leg(LegLaw { steady, growing, viscosity, drag, velocity }, 1.0, rtol)?;
        // The chain rule from the five numbers of the leg to the parameter, at fixed time.
        let at_fixed_time = |which: usize| -> f64 {
            moved.iter().zip(&end.derivatives).map(|(number, derivative)| number.eps * derivative[which]).sum()
        };
        let [way_end, u] = end.state;
        let [d_way, d_u] = [at_fixed_time(0), at_fixed_time(1)];
        let rate = -(steady + growing * way_end + (viscosity + drag * u) * u);
        let is_rest = event.kind == EventKind::Rest;
        let limit = if event.kind == EventKind::Exit { problem.exit_depth } else { law.end };
        entry = if is_rest {
            // u = 0: the depth does not move with the time of rest.
            let depth = Dual64::new(event.state.depth, entry.depth.eps + unit_depth * d_way);
            State { time, depth, velocity: Dual64::from_re(0.0) }
        } else {
            let later = ((limit.eps - entry.depth.eps) / unit_depth - d_way) / u;
            let velocity = Dual64::new(event.state.velocity, unit_velocity * (d_u + rate * later));
            State { time, depth: limit, velocity }
        };
    }
    Ok(entry)
}

/// Sensitivities by the forward sensitivities of the library `diffsol` (Tsitouras 5(4)) at tolerance `rtol`.
///
/// # Errors
/// [`SensitivityError`].
#[cfg(feature = "diffsol")]
pub fn by_diffsol(scene: &Scene, rtol: f64) -> Result<Sensitivities, SensitivityError> {
    by_flight(scene, |problem| fly_by_diffsol(problem, rtol))
}

fn blank(scene: &Scene, parameter: Parameter) -> Result<Sensitivity, ParameterError> {
    let value = parameter.get(scene)?;
    Ok(Sensitivity { parameter, value, depth: None, velocity: None, critical_velocity: None })
}

impl Sensitivities {
    /// Largest difference of the elasticities from those of `other`, relative to the larger of one and their size;
    /// `None` where no quantity has both.
    ///
    /// V_r is a root that loses digits by itself just above V_c (theory section 8), and its derivative with it: its
    /// difference counts times `(V_r/V0)²`, which is that of the exit margin's derivative.
    pub fn disagreement(&self, other: &Self) -> Option<f64> {
        let mut worst: Option<f64> = None;
        let impact_speed = self.entries.iter().find(|e| e.parameter == Parameter::Velocity).map(|e| e.value);
        for (ours, theirs) in self.entries.iter().zip(&other.entries) {
            let of = |get: fn(&Sensitivity) -> Option<f64>, quantity: Option<f64>| {
                // Where the number is zero all elasticities are; then the derivatives themselves are compared.
                let scale =
                    if ours.value == 0.0 { get(ours).filter(|d| *d != 0.0)?.recip() * quantity? } else { ours.value };
                let a = elasticity(get(ours), quantity, scale)?;
                let b = elasticity(get(theirs), quantity, scale)?;
                Some((a - b).abs() / a.abs().max(1.0))
            };
            let q = &self.quantities;
            let share = q.velocity.zip(impact_speed).map_or(1.0, |(residual, impact)| (residual / impact).powi(2));
            for difference in [
                of(|s| s.depth, q.depth),
                of(|s| s.velocity, q.velocity).map(|difference| difference * share),
                of(|s| s.critical_velocity, q.critical_velocity),
            ]
            .into_iter()
            .flatten()
            {
                // A NaN is kept, and is no agreement.
                worst = Some(
                    worst.map_or(difference, |w| if difference > w || difference.is_nan() { difference } else { w }),
                );
            }
        }
        worst
    }
}

/// A number of the scene with its relative standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The number.
    pub parameter: Parameter,
    /// Standard deviation of its logarithm, which for small spreads is its relative standard deviation.
    pub relative: f64,
}

/// Why a text is no spread: a mistake of the caller, exit code 2.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SpreadError {
    /// Not `PATH=REL`.
    #[error("`{text}` is not of the form PATH=REL, REL from 0 to 1 or in percent")]
    Form {
        /// The text.
        text: String,
    },
    /// The number.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A group, which is no input.
    #[error("`{0}` is a group of inputs: give the spreads of the numbers themselves")]
    Group(Parameter),
    /// A number twice: which of the two is meant nobody can tell.
    #[error("`{0}` has two spreads")]
    Twice(Parameter),
}

/// Reads `texts` as spreads of different numbers.
///
/// # Errors
/// [`SpreadError`].
pub fn spreads(texts: &[String]) -> Result<Vec<Spread>, SpreadError> {
    let mut all: Vec<Spread> = Vec::with_capacity(texts.len());
    for text in texts {
        let spread: Spread = text.parse()?;
        if all.iter().any(|earlier| earlier.parameter == spread.parameter) {
            return Err(SpreadError::Twice(spread.parameter));
        }
        all.push(spread);
    }
    Ok(all)
}

impl std::str::FromStr for Spread {
    type Err = SpreadError;

    fn from_str(text: &str) -> Result<Self, SpreadError> {
        let form = || SpreadError::Form { text: text.to_owned() };
        let (path, relative) = text.split_once('=').ok_or_else(form)?;
        let parameter: Parameter = path.trim().parse()?;
        if parameter.moves() != parameter {
            return Err(SpreadError::Group(parameter));
        }
        let (digits, unit) = match relative.trim().strip_suffix('%') {
            Some(digits) => (digits.trim(), 0.01),
            None => (relative.trim(), 1.0),
        };
        let relative = digits.parse::<f64>().map_err(|_| form())? * unit;
        if !(0.0..=1.0).contains(&relative) {
            return Err(form());
        }
        Ok(Self { parameter, relative })
    }
}

/// How sure V_c is when inputs have spreads.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// V_c at the scene's own numbers [m/s].
    pub critical_velocity: f64,
    /// Standard deviation to first order [m/s]: root of the sum of squares of elasticity times spread, times V_c.
    pub first_order: f64,
    /// Share of each spread in the variance, in the order given; they sum up to one.
    pub shares: Vec<f64>,
    /// Samples that had a critical velocity.
    pub samples: usize,
    /// Samples that were no admissible scene (a nose factor above one, say), left out.
    pub inadmissible: usize,
    /// Mean of the samples [m/s].
    pub mean: f64,
    /// Standard deviation of the samples [m/s].
    pub deviation: f64,
    /// Quantiles 2.5, 50 and 97.5 % of the samples [m/s].
    pub quantiles: [f64; 3],
}

/// Samples drawn from one seed; a chunk is the unit of parallel work, so that results do not depend on threads.
const CHUNK: usize = 4096;

/// Uncertainty of V_c of `scene` from independent `spreads`: to first order, and by `samples` random scenes.
///
/// Each input is multiplied by `exp(r z)`, z normal: it stays above zero, and its median is the scene's value. S is
/// multiplied on top of what Eq. 14 makes of the strength. V_c of a sample is the exact one, or through the energy
/// method. The same seed gives the same numbers on any number of threads.
///
/// # Errors
/// [`SensitivityError`]: no critical velocity, a number that the scene lacks or that V_c does not depend on, or no
/// admissible sample at all.
pub fn uncertainty(
    scene: &Scene,
    spreads: &[Spread],
    samples: usize,
    seed: u64,
) -> Result<Uncertainty, SensitivityError> {
    if spreads.iter().any(|spread| spread.parameter == Parameter::Velocity) {
        return Err(SensitivityError::NoInput);
    }
    // Titles and velocities have no part in V_c, and a clone without a title allocates nothing.
    let base = Scene { title: None, velocity: None, ..scene.clone() };
    let mut spreads: Vec<(usize, Spread)> = spreads.iter().copied().enumerate().collect();
    spreads.sort_by_key(|(_, spread)| spread.parameter);
    let derivatives = match by_closed_form(&base)? {
        full if full.entries.iter().any(|e| e.critical_velocity.is_some()) => full,
        _ => by_taylor(&base)?,
    };
    let critical = derivatives
        .quantities
        .critical_velocity
        .ok_or_else(|| SensitivityError::NoCritical(derivatives.notes.join("; ")))?;
    let mut shares = vec![0.0; spreads.len()];
    for (place, spread) in &spreads {
        spread.parameter.get(&base)?;
        let entry = derivatives.entries.iter().find(|entry| entry.parameter == spread.parameter);
        let elasticity = entry.and_then(|e| elasticity(e.critical_velocity, Some(critical), e.value)).unwrap_or(0.0);
        shares[*place] = (elasticity * spread.relative).powi(2);
    }
    let variance: f64 = shares.iter().sum();
    if variance > 0.0 {
        for share in &mut shares {
            *share /= variance;
        }
    }

    let chunks = samples.div_ceil(CHUNK);
    let drawn: Vec<Option<f64>> = (0..chunks)
        .into_par_iter()
        .flat_map_iter(|chunk| {
            let mut random = Random::for_part(seed, &format!("spread {chunk}"));
            let count = CHUNK.min(samples - chunk * CHUNK);
            (0..count).map(|_| sample(&base, &spreads, &mut random)).collect::<Vec<_>>()
        })
        .collect();
    let mut velocities: Vec<f64> = drawn.iter().copied().flatten().collect();
    if velocities.is_empty() {
        return Err(SensitivityError::NoCritical("no random scene was admissible".to_owned()));
    }
    velocities.par_sort_unstable_by(f64::total_cmp);
    let count = velocities.len() as f64;
    let mean = velocities.iter().sum::<f64>() / count;
    let squares: f64 = velocities.iter().map(|v| (v - mean) * (v - mean)).sum();
    let quantile = |share: f64| velocities[(share * (count - 1.0)).round() as usize];
    Ok(Uncertainty {
        critical_velocity: critical,
        first_order: variance.sqrt() * critical,
        shares,
        samples: velocities.len(),
        inadmissible: samples - velocities.len(),
        mean,
        deviation: (squares / (count - 1.0).max(1.0)).sqrt(),
        quantiles: [quantile(0.025), quantile(0.5), quantile(0.975)],
    })
}

/// V_c of one random scene; `None` where it is not admissible.
fn sample(base: &Scene, spreads: &[(usize, Spread)], random: &mut Random) -> Option<f64> {
    let mut scene = base.clone();
    for (_, Spread { parameter, relative }) in spreads {
        let value = parameter.get(&scene).ok()? * (relative * normal(random)).exp();
        parameter.set(&mut scene, value).ok()?;
    }
    // The closed form takes any numbers; whether they are admissible is for the scene to say.
    scene.resolve(1.0).ok()?;
    critical_velocity::exact(&scene)
        .ok()
        .or_else(|| critical_velocity::of_scene(&scene, &Energy::new()).ok().map(|found| found.velocity))
        .or_else(|| critical_velocity::of_scene(&scene, &Taylor::default()).ok().map(|found| found.velocity))
}

/// A standard normal number by the method of Box and Muller.
fn normal(random: &mut Random) -> f64 {
    // 1 - u lies in (0, 1]: its logarithm is finite.
    let radius = (-2.0 * (1.0 - random.unit()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.unit()).cos()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::physics::scene_file::SHIPPED;
    use crate::studies::random_scenes::Generator;

    fn shipped(name: &str) -> Scene {
        Scene::from_toml(SHIPPED.iter().find(|(n, _)| *n == name).unwrap().1, name).unwrap()
    }

    fn entry(all: &Sensitivities, parameter: Parameter) -> Sensitivity {
        *all.entries.iter().find(|e| e.parameter == parameter).unwrap()
    }

    #[test]
    fn lifted_problem_is_the_one_that_the_scene_resolves_into() {
        for (name, _) in SHIPPED {
            let scene = shipped(name);
            let Some(speed) = scene.velocity else { continue };
            let ours = problem_in(&scene, speed, |_, value| value).unwrap();
            let theirs = scene.resolve(speed).unwrap();
            assert_eq!(
                (ours.crater, ours.target, ours.stages.len()),
                (theirs.crater, theirs.target, theirs.stages.len())
            );
            for (a, b) in ours.stages.iter().zip(&theirs.stages) {
                for (a, b) in [
                    (a.static_force, b.static_force),
                    (a.stiffness, b.stiffness),
                    (a.viscosity, b.viscosity),
                    (a.drag, b.drag),
                    (a.end, b.end),
                    (ours.exit_depth, theirs.exit_depth),
                ] {
                    assert!(a == b || (a / b - 1.0).abs() < 4e-15, "{name}: {a} {b}");
                }
            }
        }
    }

    /// The two roads share the scene and nothing else; the bar of the issue is 1e-12.
    #[test]
    fn taylor_and_closed_form_agree_on_every_derivative_of_every_shipped_scene() {
        let mut compared = 0;
        for (name, _) in SHIPPED {
            let scene = shipped(name);
            if scene.resolve(scene.velocity.unwrap()).unwrap().stages.iter().any(|s| s.viscosity > 0.0) {
                continue;
            }
            let (exact, flown) = (by_closed_form(&scene).unwrap(), by_taylor(&scene).unwrap());
            if let Some(difference) = exact.disagreement(&flown) {
                assert!(difference < 1e-12, "{name}: {difference:e}\n{exact:?}\n{flown:?}");
                compared += 1;
            }
        }
        assert!(compared >= 10, "{compared}");
    }

    /// Random scenes over all groups, both crater constants and both criteria.
    #[test]
    fn taylor_and_closed_form_agree_on_random_scenes() {
        let mut scenes = Generator::new(11, "sensitivity");
        let (mut compared, mut worst) = (0, 0.0_f64);
        for index in 0..300 {
            let mut scene = scenes.next_scene();
            if index % 3 == 0 {
                scene.criterion = Criterion::Ndrc;
            }
            let exact = match by_closed_form(&scene) {
                // Drag over a thick slab may ask for more energy than there are numbers.
                Err(SensitivityError::Resolve(_)) => continue,
                other => other.unwrap(),
            };
            let flown = by_taylor(&scene).unwrap();
            if let Some(difference) = exact.disagreement(&flown) {
                assert!(difference < 1e-12, "{scene:?}: {difference:e}\n{exact:?}\n{flown:?}");
                worst = worst.max(difference);
                compared += 1;
            }
        }
        assert!(compared >= 250 && worst > 0.0, "{compared} {worst:e}");
    }

    /// The library's own forward sensitivities, restarted behind every kink; the bar of the issue is 1e-7.
    #[cfg(feature = "diffsol")]
    #[test]
    fn forward_sensitivities_of_the_library_agree_to_1e_7() {
        let mut worst = 0.0_f64;
        for name in ["paper-slab", "tunnel", "crater", "jump", "jump-perforate", "perforate", "layered", "graze"] {
            let scene = shipped(name);
            let (exact, library) = (by_closed_form(&scene).unwrap(), by_diffsol(&scene, 1e-10).unwrap());
            let difference = exact.disagreement(&library).unwrap();
            assert!(difference < 1e-7, "{name}: {difference:e}\n{exact:?}\n{library:?}");
            worst = worst.max(difference);
        }
        // A comparison of a thing with itself would leave nothing.
        assert!(worst > 1e-15, "{worst:e}");
        let viscous = shipped("viscous");
        let difference = by_taylor(&viscous).unwrap().disagreement(&by_diffsol(&viscous, 1e-10).unwrap());
        assert!(difference.unwrap() < 1e-7, "{difference:?}");
    }

    /// Symmetric differences of the closed form itself: independent of every dual number, good to about 1e-9.
    #[test]
    fn derivatives_are_those_of_differences() {
        for name in ["paper-slab", "tunnel", "crater", "jump", "jump-perforate", "perforate", "forrestal-1994-shot-14"]
        {
            let scene = shipped(name);
            let all = by_closed_form(&scene).unwrap();
            for e in &all.entries {
                let at = |factor: f64| {
                    let mut moved = scene.clone();
                    e.parameter.set(&mut moved, e.value * factor).unwrap();
                    let flight = located(&moved.problem().unwrap()).unwrap();
                    (flight.end.depth, flight.end.velocity, critical_velocity::exact(&moved).ok())
                };
                let step = 1e-4;
                // Fourth order: 8 (f(h) - f(-h)) less (f(2h) - f(-2h)), over 12.
                let slope = |get: &dyn Fn((f64, f64, Option<f64>)) -> f64| {
                    let f = |n: f64| get(at(1.0 + n * step));
                    (8.0 * (f(1.0) - f(-1.0)) - (f(2.0) - f(-2.0))) / (12.0 * step)
                };
                let check = |ours: Option<f64>, numeric: f64, size: Option<f64>, what: &str| {
                    if let (Some(ours), Some(size)) = (ours, size) {
                        let error = (ours * e.value - numeric).abs() / size;
                        assert!(error < 2e-8, "{name} {} {what}: {} {numeric}", e.parameter, ours * e.value);
                    }
                };
                if e.value > 0.0 && e.parameter != Parameter::NoseFactor {
                    check(e.depth, slope(&|f| f.0), all.quantities.depth, "depth");
                    check(e.velocity, slope(&|f| f.1), all.quantities.velocity, "velocity");
                    check(
                        e.critical_velocity,
                        slope(&|f| f.2.unwrap_or(f64::NAN)),
                        all.quantities.critical_velocity,
                        "V_c",
                    );
                }
            }
        }
    }

    /// Without drag V_c² = P (2 H - k d)/M: elasticities by hand.
    #[test]
    fn elasticities_without_drag_are_those_found_by_hand() {
        let mut scene = shipped("paper-slab");
        Parameter::Density.set(&mut scene, 0.0).unwrap();
        let all = by_closed_form(&scene).unwrap();
        let critical = all.quantities.critical_velocity;
        let of = |parameter| {
            let e = entry(&all, parameter);
            elasticity(e.critical_velocity, critical, e.value).unwrap()
        };
        assert!((of(Parameter::Mass) + 0.5).abs() < 1e-14);
        assert!((of(Parameter::StaticFactor) - 0.5).abs() < 1e-14);
        // S follows as fc^-1/2, so P as fc^1/2.
        assert!((of(Parameter::Strength) - 0.25).abs() < 1e-14);
        // 2 H/(2 H - k d)/2 with H/d = 5, k = 2.
        assert!((of(Parameter::Thickness) - 10.0 / 16.0).abs() < 1e-14);
        assert!((of(Parameter::CraterRatio) + 1.0 / 8.0).abs() < 1e-14);
    }

    #[test]
    fn viscous_stages_have_derivatives_by_taylor_alone_and_it_is_said() {
        let scene = shipped("viscous");
        let exact = by_closed_form(&scene).unwrap();
        assert!(exact.entries.iter().all(|e| e.depth.is_none()));
        let flown = by_taylor(&scene).unwrap();
        assert!(flown.entries.iter().any(|e| e.depth.is_some_and(|d| d < 0.0)));
        assert_eq!(exact.disagreement(&flown), None);
    }

    #[test]
    fn a_spread_is_of_an_input_of_v_c_and_there_once() {
        let texts = |all: &[&str]| spreads(&all.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>());
        let twice = texts(&["target.strength=2%", "projectile.mass=1%", "target.strength=0.02"]);
        assert_eq!(twice, Err(SpreadError::Twice(Parameter::Strength)));
        let two = texts(&["target.strength=2%", "impact.velocity=1%"]).unwrap();
        assert_eq!(uncertainty(&shipped("paper-slab"), &two, 10, 1), Err(SensitivityError::NoInput));
        assert!(uncertainty(&shipped("paper-slab"), &two[..1], 10, 1).is_ok());
    }

    #[test]
    fn monte_carlo_meets_first_order_for_small_spreads_and_repeats_itself() {
        let scene = shipped("paper-slab");
        let spreads = ["target.strength=2%", "projectile.mass=0.01", "resistance.S=0.02"].map(|s| s.parse().unwrap());
        let found = uncertainty(&scene, &spreads, 20_000, 7).unwrap();
        assert_eq!((found.samples, found.inadmissible), (20_000, 0));
        // The deviation of 20,000 samples has a standard error of 0.5 %.
        assert!((found.deviation / found.first_order - 1.0).abs() < 0.02, "{found:?}");
        assert!((found.mean / found.critical_velocity - 1.0).abs() < 1e-3);
        assert!((found.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(found, uncertainty(&scene, &spreads, 20_000, 7).unwrap());
        assert_ne!(found.mean, uncertainty(&scene, &spreads, 20_000, 8).unwrap().mean);
    }

    #[test]
    fn samples_beyond_the_admissible_are_counted_and_left_out() {
        let scene = shipped("paper-slab");
        let spreads = ["projectile.nose.factor=0.1".parse().unwrap()];
        let found = uncertainty(&scene, &spreads, 1000, 1).unwrap();
        // The nose is flat, N* = 1: half of the samples are above one.
        assert!((400..600).contains(&found.inadmissible), "{found:?}");
    }

    #[test]
    fn spreads_that_say_nothing_definite_are_refused() {
        for text in [
            "projectile.mass",
            "projectile.mass=x",
            "projectile.mass=-0.1",
            "projectile.mass=nan",
            "projectile.mass=200%",
        ] {
            assert!(matches!(text.parse::<Spread>(), Err(SpreadError::Form { .. })), "{text}");
        }
        assert!(matches!("H/d=0.1".parse::<Spread>(), Err(SpreadError::Group(_))));
        assert_eq!("projectile.mass=5 %".parse::<Spread>().unwrap().relative, 0.05);
    }
}
