//! How each kind of claim is measured: one function a kind, grouped by what it needs.

mod agreement;
mod applications;
mod formulas;
mod invariants;
mod manufactured;
mod orders;
mod peers;
pub(super) mod scheme;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::claim::{Check, Claim, Measurement, NotMeasured};
use super::suite::Scenes;
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{Detail, Flight};
use crate::physics::{Problem, Resistance, Scene};
use crate::studies::convergence::{QuantityStudy, Yardstick};
use crate::studies::quantity::Quantity;
use crate::studies::relations::Units;

pub use peers::PeerAnswers;

/// Studies that several claims share, computed once: one run of a scheme gives every quantity.
#[derive(Debug, Default)]
pub struct Memo(Mutex<HashMap<String, Arc<OnceLock<Studied>>>>);

type Studied = Result<Arc<Vec<QuantityStudy>>, NotMeasured>;

impl Memo {
    /// The studies under `key`, by `compute` if nobody has asked for them yet; whoever asks meanwhile waits.
    fn get(&self, key: String, compute: impl FnOnce() -> Result<Vec<QuantityStudy>, NotMeasured>) -> Studied {
        let cell = self.0.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default().clone();
        cell.get_or_init(|| compute().map(Arc::new)).clone()
    }
}

/// What every check may use.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// Scenes by name.
    pub scenes: &'a Scenes,
    /// Answers of other programs.
    pub peers: &'a PeerAnswers,
    /// Studies that claims share.
    pub memo: &'a Memo,
    /// Seed of every random number.
    pub seed: u64,
}

/// Measures `claim`.
///
/// # Errors
/// [`NotMeasured`]: the claim does not apply to its scene, or the measurement itself failed.
pub fn measure(claim: &Claim, context: Context<'_>) -> Result<Measurement, NotMeasured> {
    let on = |check: fn(&Subject<'_>) -> Result<Measurement, NotMeasured>| check(&Subject::of(claim, context)?);
    match claim.check {
        Check::Reference { random } => agreement::reference(claim, context, random),
        Check::Agreement { rtol } => agreement::with_exact(&Subject::of(claim, context)?, rtol),
        Check::Stated { value } => agreement::stated(&Subject::of(claim, context)?, value),
        Check::Margin { points } => agreement::margin(&Subject::of(claim, context)?, points),
        Check::Clock { steps } => scheme::clock(&Subject::of(claim, context)?, steps),
        Check::Nose {} => formulas::nose(),
        Check::GridConvergence {} => on(orders::grid_convergence),
        Check::CraterBand {} => on(scheme::crater_band),
        Check::Outcome { ref is } => agreement::outcome(&Subject::of(claim, context)?, is),
        Check::Pair { with, tolerance } => agreement::pair(&Subject::of(claim, context)?, with, tolerance),
        Check::EventOrder {} => on(agreement::event_order),
        Check::SmallImpact { from, to, points } => formulas::small_impact(claim, context, (from, to), points),
        Check::ApproachOrder { impact } => formulas::approach_order(claim, impact),
        Check::ApproachConstant { impact } => formulas::approach_constant(claim, impact),
        Check::Eq15 { form, from, to } => formulas::eq15(form, from, to),
        Check::Eq15Jump { form, at, jump } => formulas::eq15_jump(form, at, jump),
        Check::NdrcCriterion { points } => formulas::ndrc_criterion(claim, context, points),
        Check::Order { order, steps, points } => {
            orders::fixed_step(&Subject::of(claim, context)?, order, steps, points)
        }
        Check::Proportionality { from, to } => orders::proportionality(&Subject::of(claim, context)?, from, to),
        Check::WorkOrder { from, to } => orders::work_order(&Subject::of(claim, context)?, from, to),
        Check::SelfConvergence {} => on(orders::self_convergence),
        Check::DiscreteSolution { step, steps } => {
            scheme::discrete_solution(&Subject::of(claim, context)?, step, steps)
        }
        Check::CraterConstant {} => on(scheme::crater_constant),
        Check::LaggedConstant {} => on(scheme::lagged_constant),
        Check::StabilityLimit {} => on(scheme::stability_limit),
        Check::EnergyBalance {} => on(invariants::energy_balance),
        Check::TimeReversal {} => on(invariants::time_reversal),
        Check::Similarity { length, mass, time } => {
            invariants::similarity(&Subject::of(claim, context)?, Units { length, mass, time })
        }
        Check::Split { pieces } => invariants::split(&Subject::of(claim, context)?, pieces),
        Check::Manufactured { path, order } => manufactured::order(claim, context, path, order),
        Check::Sweep { from, to, points } => applications::sweep(&Subject::of(claim, context)?, [from, to], points),
        Check::Map { points } => applications::map(claim, points),
        Check::MeasuredDepth {} => applications::measured_depth(claim),
        Check::Sensitivities {} => on(applications::sensitivities),
        Check::StabilityMap { points } => scheme::stability_map(points),
        Check::RoundingFloor { from, to } => scheme::rounding_floor(&Subject::of(claim, context)?.problem, from, to),
        Check::Peer { ref name, tolerance } => peers::agreement(&Subject::of(claim, context)?, name, tolerance),
    }
}

/// A claim with its scene resolved.
pub(super) struct Subject<'a> {
    pub(super) claim: &'a Claim,
    pub(super) context: Context<'a>,
    pub(super) scene: &'a Scene,
    pub(super) problem: Problem,
}

impl<'a> Subject<'a> {
    fn of(claim: &'a Claim, context: Context<'a>) -> Result<Self, NotMeasured> {
        let name = claim.scene.as_deref().ok_or_else(|| NotMeasured::broken("the claim names no scene"))?;
        let scene = context.scenes.get(name).ok_or_else(|| NotMeasured::broken(format!("no scene {name}")))?;
        let problem = scene.problem().map_err(NotMeasured::broken)?;
        Ok(Self { claim, context, scene, problem })
    }

    /// Quantity of the claim.
    fn quantity(&self) -> Result<Quantity, NotMeasured> {
        self.claim.quantity.ok_or_else(|| NotMeasured::broken("the claim names no quantity"))
    }

    /// Name of the claim's method; the Taylor series where it names none.
    fn method_name(&self) -> MethodName {
        self.claim.method.unwrap_or_default()
    }

    /// The claim's method at a tolerance, or at its default.
    fn method(&self, rtol: Option<f64>) -> Result<Method, NotMeasured> {
        build(self.method_name(), &MethodOptions { rtol, ..MethodOptions::default() })
    }

    /// A flight of the claim's problem; a method that refuses it makes the claim inapplicable.
    fn fly(&self, method: &Method, detail: Detail) -> Result<Flight, NotMeasured> {
        fly(method, &self.problem, detail)
    }

    /// The exact flight, or a refined one.
    fn yardstick(&self) -> Result<Yardstick, NotMeasured> {
        Yardstick::of(&self.problem).map_err(NotMeasured::broken)
    }

    /// Whether the scene is one crater and one tunnel.
    fn is_plain_concrete(&self) -> bool {
        matches!(&self.scene.resistance, Resistance::Concrete(c) if c.layers.is_empty())
    }
}

/// The method `name`; one that this build lacks makes the claim inapplicable.
fn build(name: MethodName, options: &MethodOptions) -> Result<Method, NotMeasured> {
    if !name.is_built() {
        return Err(NotMeasured::skip(format!("this build leaves out {name}")));
    }
    Method::new(name, options).map_err(NotMeasured::broken)
}

/// A flight; a refusal of the method makes the claim inapplicable, a failure breaks it.
fn fly(method: &Method, problem: &Problem, detail: Detail) -> Result<Flight, NotMeasured> {
    method.integrator().fly(problem, detail).map_err(|error| {
        if error.is_usage() { NotMeasured::skip(error.to_string()) } else { NotMeasured::broken(error) }
    })
}
