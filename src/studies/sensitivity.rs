//! Derivatives of depth, residual velocity and critical velocity with respect to every number of a scene, and the
//! uncertainty of V_c.
//!
//! Derivatives come from dual numbers, by two methods that share only the scene:
//!
//! - **closed form**: W = V² over depth has an exact formula ([`crate::physics::exit_energy`]), and each quantity is
//!   implicit in it:
//!
//!   ```text
//!   W(X; p) = 0    dX/dp   = (M/2F(X)) dW/dp      rest
//!   V_r² = W(H; p) dV_r/dp = (dW/dp)/(2 V_r)      perforation, H moving with p
//!   W(H; V_c, p) = 0  dV_c/dp = -(dW/dp)/(dW/dV0)
//!   ```
//!
//! - **Taylor**: the integrator itself solves in dual numbers, over time, its events moving with the parameter.
//!
//! If no S is stated, it follows the strength by Eq. 14, and the derivative with respect to the strength includes that of S, as in a sweep.
//! S itself is also listed, for the uncertainty of Eq. 14.

use num_dual::Dual64;
use rayon::prelude::*;
use serde::Serialize;

use super::critical_velocity;
use super::error::{Studied, StudyError, Truth};
use super::experiments::{self, resistance};
use super::perforating_velocities;
use super::random::Random;
use super::sweep::as_text;
#[cfg(feature = "diffsol")]
use crate::integrators::diffsol_sensitivity;
use crate::integrators::{ClosedForm, Detail, Energy, Solved, Taylor};
#[cfg(feature = "diffsol")]
use crate::physics::EventKind;
use crate::physics::parameter::{LayerNumber, Parameter, ParameterError};
use crate::physics::{Outcome, Problem, Resistance, Resolved, Scene, State, closed_form};

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
    /// Depth at rest X (m).
    pub depth: Option<f64>,
    /// Residual velocity V_r (m/s).
    pub velocity: Option<f64>,
    /// Critical velocity V_c (m/s).
    pub critical_velocity: Option<f64>,
}

/// Quantities and their derivatives, by one method.
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

/// The problem of `scene` at `speed` (m/s) with the derivative in `parameter`.
fn dual_problem(scene: &Scene, speed: f64, parameter: Parameter) -> Resolved<Problem<Dual64>> {
    scene.resolve_in(speed, |number, value| Dual64::new(value, slope(scene, number, value, parameter)))
}

/// Derivative of `number`, which is `value`, with respect to `parameter`, with the same dependences as [`Parameter::set`].
fn slope(scene: &Scene, number: Parameter, value: f64, parameter: Parameter) -> f64 {
    use Parameter::{Layer, StaticFactor, Strength, Thickness};
    let follows = match (number, parameter) {
        (Thickness, Layer(_, LayerNumber::Thickness)) => return 1.0,
        (StaticFactor, Strength) => true,
        (Layer(of, LayerNumber::StaticFactor), Layer(index, LayerNumber::Strength)) => of == index,
        _ => false,
    };
    match parameter.get(scene) {
        // S by Eq. 14 goes as fc^(-1/2).
        // That of an air gap is zero, and stays so.
        Ok(strength) if follows && strength > 0.0 && parameter.moves_static_factor(scene) => -0.5 * value / strength,
        _ => f64::from(u8::from(number == parameter)),
    }
}

/// Most stages to be solved for the derivatives of one quantity: seconds.
const STAGES_MAX: usize = 1_000_000;

/// The numbers of `scene` that are affordable: of very many stages or layers those that they share.
fn affordable(scene: &Scene, notes: &mut Vec<String>) -> Vec<Parameter> {
    let mut parameters = Parameter::all_of(scene);
    let stages = match &scene.resistance {
        Resistance::Concrete(concrete) => concrete.layers.len() + 2,
        Resistance::Stages(stages) => stages.len(),
    };
    let solved = parameters.len().saturating_mul(stages);
    if solved > STAGES_MAX {
        parameters.retain(|parameter| !matches!(parameter, Parameter::Layer(..) | Parameter::Stage(..)));
        notes.push(format!(
            "the numbers of the single stages are left out: all derivatives would take {solved} stages to solve, and \
             {STAGES_MAX} are allowed; `critical --spread stage.0.drag=1%` takes chosen ones"
        ));
    }
    parameters
}

/// The quantities of `scene` that have derivatives; `notes` says why one has none.
fn quantities(scene: &Scene, notes: &mut Vec<String>) -> Studied<Quantities> {
    let mut quantities = Quantities::default();
    if let Some(speed) = scene.velocity {
        let flight = Truth::of(&scene.resolve(speed)?)?.flight;
        match flight.outcome {
            Outcome::Undecided => {
                notes.push("the flight is undecided: X and V_r have no derivative at the critical velocity".to_owned());
            }
            Outcome::Perforated => quantities.velocity = Some(flight.end.velocity),
            _ => quantities.depth = Some(flight.end.depth),
        }
    }
    if scene.thickness.is_some() {
        let why_not = match critical_velocity::exact_or_refined(scene) {
            Ok(velocity) if velocity > 0.0 => {
                let problem = scene.resolve(velocity)?;
                let (start, limit) = (|index| problem.start_of(index), |index| problem.limit_of(index));
                let stages = problem.stages.iter().enumerate();
                let may_cross = perforating_velocities::may_cross(&problem);
                let resists = |(index, stage): (usize, &crate::physics::Stage)| match problem.laws.of(index) {
                    Some(law) => law.resists_between(start(index), limit(index)),
                    None => stage.resists_between(start(index), limit(index)),
                };
                if !may_cross && stages.into_iter().all(resists) {
                    quantities.critical_velocity = Some(velocity);
                    return Ok(quantities);
                }
                let why =
                    if may_cross { "paths may cross here" } else { "a stage drives, and V_c may stand on a barrier" };
                why.to_owned()
            }
            Ok(_) => "it is zero".to_owned(),
            Err(error) => error.to_string(),
        };
        notes.push(format!("V_c not differentiated: {why_not}"));
    }
    Ok(quantities)
}

/// Derivatives of the quantities of `scene` with respect to `wanted`, or to each of its numbers, from its problems in dual
/// numbers.
///
/// - `end`: dX/dp and dV_r/dp.
/// - `excess`: dg/dp of any function g that is zero at V_c, so that `dV_c/dp = -(dg/dp)/(dg/dV0)`.
fn differentiate(
    scene: &Scene,
    wanted: Option<&[Parameter]>,
    end: impl Fn(&Problem<Dual64>, Quantities) -> Solved<[Option<f64>; 2]>,
    excess: impl Fn(Problem<Dual64>) -> Solved<Option<f64>>,
) -> Studied<Sensitivities> {
    let mut notes = Vec::new();
    let parameters = wanted.map_or_else(|| affordable(scene, &mut notes), <[_]>::to_vec);
    let quantities = quantities(scene, &mut notes)?;
    let at_critical = |parameter| -> Studied<Option<f64>> {
        let Some(critical) = quantities.critical_velocity else { return Ok(None) };
        Ok(excess(dual_problem(scene, critical, parameter)?)?)
    };
    let faster = at_critical(Parameter::Velocity)?;
    let speed = scene.velocity.filter(|_| quantities.depth.or(quantities.velocity).is_some());
    let mut entries = Vec::new();
    for parameter in parameters {
        let [depth, velocity] = match speed {
            Some(speed) => end(&dual_problem(scene, speed, parameter)?, quantities)?,
            None => [None; 2],
        };
        let moved = if parameter == Parameter::Velocity { None } else { at_critical(parameter)? };
        let critical_velocity = moved.zip(faster).map(|(moved, faster)| -moved / faster);
        entries.push(Sensitivity { parameter, value: parameter.get(scene)?, depth, velocity, critical_velocity });
    }
    Ok(Sensitivities { quantities, entries, notes })
}

/// W = V² (m²/s²) at `depth`; `None` beyond a viscous stage, with a law of its own, and where a viscosity has the derivative.
fn squared_speed(problem: &Problem<Dual64>, depth: Dual64) -> Option<Dual64> {
    let without_viscosity = problem.stages.iter().all(|law| law.viscosity.eps == 0.0);
    (without_viscosity && problem.laws.is_empty()).then(|| closed_form::squared_speed_at(problem, depth))?
}

/// Sensitivities by the closed form of W over depth.
///
/// Quantities beyond a viscous stage, and derivatives with respect to a viscosity, are left out.
///
/// # Errors
/// [`StudyError`]: the scene does not resolve, or the projectile neither rests nor leaves.
pub fn by_closed_form(scene: &Scene) -> Studied<Sensitivities> {
    closed_form_of(scene, None)
}

fn closed_form_of(scene: &Scene, wanted: Option<&[Parameter]>) -> Studied<Sensitivities> {
    let end = |problem: &Problem<Dual64>, quantities: Quantities| {
        let half_slope = |depth: Dual64| squared_speed(problem, depth).map(|w| 0.5 * w.eps);
        let depth = quantities.depth.and_then(|depth| {
            let law = problem.stages.iter().find(|law| law.end.re >= depth)?.values();
            Some(problem.mass.re * half_slope(Dual64::from_re(depth))? / law.force(depth, 0.0))
        });
        let velocity = quantities.velocity.filter(|velocity| *velocity > 0.0);
        Ok([depth, velocity.and_then(|velocity| Some(half_slope(problem.exit_depth)? / velocity))])
    };
    differentiate(scene, wanted, end, |problem| Ok(squared_speed(&problem, problem.exit_depth).map(|w| w.eps)))
}

/// Sensitivities by the Taylor series in dual numbers.
///
/// # Errors
/// [`StudyError`].
pub fn by_taylor(scene: &Scene) -> Studied<Sensitivities> {
    taylor_of(scene, None)
}

fn taylor_of(scene: &Scene, wanted: Option<&[Parameter]>) -> Studied<Sensitivities> {
    by_integration(scene, wanted, |problem| Ok(Taylor::default().solve_in(&with_every_term(problem), Detail::End)?.end))
}

/// `problem` with a negligible value, 1e-30 of a noticeable one, for each coefficient that is zero and has a derivative.
///
/// The series omits terms that are zero by value, and would lose their derivatives. With much smaller values the unit of
/// time in an air gap would be so large that its square overflows.
fn with_every_term(problem: &Problem<Dual64>) -> Problem<Dual64> {
    const NEGLIGIBLE: f64 = 1e-30;
    let mut problem = problem.clone();
    let places = problem.stages.iter().map(|law| law.end.re).chain([problem.exit_depth.re]);
    let length = places.filter(|place| place.is_finite()).fold(0.0, f64::max);
    let length = if length > 0.0 { length } else { 1.0 };
    let (mass, rate) = (problem.mass.re, problem.impact_speed.re / length);
    for law in &mut problem.stages {
        for (coefficient, noticeable) in [
            (&mut law.stiffness, mass * rate * rate),
            (&mut law.viscosity, mass * rate),
            (&mut law.drag, mass / length),
        ] {
            if coefficient.re == 0.0 && coefficient.eps != 0.0 {
                coefficient.re = NEGLIGIBLE * noticeable;
            }
        }
    }
    problem
}

/// Sensitivities by `solve`, which gives the state at the end of a problem in dual numbers.
///
/// V_c is the speed at which the rest depth of the target, continued beyond H, is H.
fn by_integration(
    scene: &Scene,
    wanted: Option<&[Parameter]>,
    solve: impl Fn(&Problem<Dual64>) -> Solved<State<Dual64>>,
) -> Studied<Sensitivities> {
    let end = |problem: &Problem<Dual64>, quantities: Quantities| {
        let State { depth, velocity, .. } = solve(problem)?;
        let residual = quantities.velocity.filter(|v| *v > 0.0);
        Ok([quantities.depth.map(|_| depth.eps), residual.map(|_| velocity.eps)])
    };
    differentiate(scene, wanted, end, |problem| {
        let exit = problem.exit_depth.eps;
        Ok(Some(solve(&problem.with_exit(Dual64::from_re(f64::INFINITY)))?.depth.eps - exit))
    })
}

/// State at the end of `problem`, with its derivative, by the forward sensitivities of the library.
///
/// Taylor says when each stage ends. The library integrates state and sensitivities up to that instant at fixed time;
/// then the movement of the event with the parameter is added, `d tau = (d xi_end - d xi)/u`.
#[cfg(feature = "diffsol")]
fn solve_by_diffsol(problem: &Problem<Dual64>, rtol: f64) -> Solved<State<Dual64>> {
    let flight = Taylor::default().solve_in(&problem.cast::<f64>(), Detail::Events)?;
    let unit_velocity = problem.impact_speed.re;
    let mut entry = State::at_impact(problem);
    for event in &flight.events {
        // Of several events at one place, only the first ends a stage of some length.
        let elapsed = event.state.time - entry.time.re;
        if elapsed <= 0.0 {
            continue;
        }
        let stage = match event.kind {
            EventKind::StageEnd(index) => index,
            EventKind::CraterEnd | EventKind::Plug => problem.crater.unwrap_or(0),
            EventKind::Exit | EventKind::Rest => flight.stage,
        };
        let law = &problem.stages[stage];
        let length = unit_velocity * elapsed;
        let force = problem.mass * unit_velocity * unit_velocity;
        let scaled = [
            (law.static_force + law.stiffness * entry.depth) * length / force,
            law.stiffness * length * length / force,
            law.viscosity * length / (problem.mass * unit_velocity),
            law.drag * length / problem.mass,
            entry.velocity / unit_velocity,
        ];
        let [xi, u] = diffsol_sensitivity::cross_stage(scaled, rtol)?;
        // The law does not depend on time, of which only the value is used.
        let time = Dual64::from_re(event.state.time);
        entry = if event.kind == EventKind::Rest {
            // u = 0: the depth does not move with the time of rest.
            let depth = Dual64::new(event.state.depth, entry.depth.eps + length * xi.eps);
            State { time, depth, velocity: Dual64::from_re(0.0) }
        } else {
            let [steady, growing, viscosity, drag, _] = scaled.map(|number| number.re);
            let rate = -(steady + growing * xi.re + (viscosity + drag * u.re) * u.re);
            let depth = if event.kind == EventKind::Exit { problem.exit_depth } else { law.end };
            let later = ((depth.eps - entry.depth.eps) / length - xi.eps) / u.re;
            let velocity = Dual64::new(event.state.velocity, unit_velocity * (u.eps + rate * later));
            State { time, depth, velocity }
        };
    }
    Ok(entry)
}

/// Sensitivities by the forward sensitivities of the library `diffsol` (Tsitouras 5(4)) at tolerance `rtol`.
///
/// # Errors
/// [`StudyError`].
#[cfg(feature = "diffsol")]
pub fn by_diffsol(scene: &Scene, rtol: f64) -> Studied<Sensitivities> {
    by_integration(scene, None, |problem| solve_by_diffsol(problem, rtol))
}

impl Sensitivities {
    /// Largest difference of the elasticities from those of `other`, relative to the larger of one and their size;
    /// `None` where no quantity has both.
    ///
    /// Just above V_c the root V_r and its derivative lose digits (docs/theory.md, section 8). Its difference is
    /// therefore multiplied by `(V_r/V0)²`, which makes it that of the exit margin's derivative.
    pub fn disagreement(&self, other: &Self) -> Option<f64> {
        let q = &self.quantities;
        let impact_speed = self.entries.iter().find(|e| e.parameter == Parameter::Velocity).map(|e| e.value);
        let share = q.velocity.zip(impact_speed).map_or(1.0, |(residual, impact)| (residual / impact).powi(2));
        let differences = self.entries.iter().zip(&other.entries).flat_map(|(ours, theirs)| {
            let of = |get: fn(&Sensitivity) -> Option<f64>, quantity: Option<f64>| {
                // Where the number is zero all elasticities are; then the derivatives themselves are compared.
                let scale =
                    if ours.value == 0.0 { get(ours).filter(|d| *d != 0.0)?.recip() * quantity? } else { ours.value };
                let a = elasticity(get(ours), quantity, scale)?;
                let b = elasticity(get(theirs), quantity, scale)?;
                Some((a - b).abs() / a.abs().max(1.0))
            };
            [
                of(|s| s.depth, q.depth),
                of(|s| s.velocity, q.velocity).map(|difference| difference * share),
                of(|s| s.critical_velocity, q.critical_velocity),
            ]
        });
        // A NaN stays: it is no agreement.
        differences.flatten().reduce(|worst, next| if next > worst || next.is_nan() { next } else { worst })
    }
}

/// A number of the scene with its relative standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Spread {
    /// Path of the number.
    #[serde(rename = "path", serialize_with = "as_text")]
    #[cfg_attr(feature = "report", schemars(with = "String"))]
    pub parameter: Parameter,
    /// Relative standard deviation; of a lognormal number that of its logarithm, which for small spreads is the same.
    pub relative: f64,
    /// How the number is distributed.
    pub distribution: Distribution,
}

/// How an uncertain number is distributed about the value v of the scene, with relative standard deviation r.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, strum::EnumString, strum::IntoStaticStr)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[strum(serialize_all = "kebab-case")]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// `v exp(r z)`, z standard normal: above zero, with the median v.
    #[default]
    Lognormal,
    /// `v (1 + r z)`: below zero it is left out.
    Normal,
    /// `v (1 + r u)`, u uniform from -√3 to √3, so that r is the standard deviation here too.
    Uniform,
}

impl Distribution {
    /// Its name.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// A random factor on v.
    fn factor(self, relative: f64, random: &mut Random) -> f64 {
        match self {
            Self::Lognormal => (relative * normal(random)).exp(),
            Self::Normal => 1.0 + relative * normal(random),
            Self::Uniform => 1.0 + relative * 3.0_f64.sqrt() * (2.0 * random.unit() - 1.0),
        }
    }
}

/// The text of a spread that is the scatter of Eq. 14 itself.
const EQ14: &str = "eq14";

/// Reads `texts` as spreads of different numbers.
///
/// # Errors
/// [`ParameterError`].
pub fn spreads(texts: &[String]) -> Result<Vec<Spread>, ParameterError> {
    let mut all: Vec<Spread> = Vec::with_capacity(texts.len());
    for text in texts {
        let spread: Spread = text.parse()?;
        if all.iter().any(|earlier| earlier.parameter == spread.parameter) {
            return Err(ParameterError::Twice(spread.parameter));
        }
        all.push(spread);
    }
    Ok(all)
}

impl std::str::FromStr for Spread {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let form = || ParameterError::Spread(text.to_owned());
        if text.trim() == EQ14 {
            let relative = scatter_of_eq14().relative;
            return Ok(Self { parameter: Parameter::StaticFactor, relative, distribution: Distribution::Lognormal });
        }
        let (path, relative) = text.split_once('=').ok_or_else(form)?;
        let (relative, distribution) = match relative.split_once(':') {
            Some((relative, name)) => (relative, name.trim().parse().map_err(|_| form())?),
            None => (relative, Distribution::default()),
        };
        let parameter: Parameter = path.trim().parse()?;
        if parameter.moves() != parameter {
            return Err(ParameterError::Group(parameter));
        }
        let (digits, unit) = relative.trim().strip_suffix('%').map_or((relative, 1.0), |digits| (digits, 0.01));
        let relative = digits.trim().parse::<f64>().map_err(|_| form())? * unit;
        if !(0.0..=1.0).contains(&relative) {
            return Err(form());
        }
        Ok(Self { parameter, relative, distribution })
    }
}

/// Standard uncertainty to first order of the quantity of `scene` whose derivative `derivative` picks; `None` without spreads.
///
/// # Errors
/// As [`by_closed_form`].
pub fn input_uncertainty(
    scene: &Scene,
    spreads: &[Spread],
    derivative: impl Fn(&Sensitivity) -> Option<f64>,
) -> Studied<Option<f64>> {
    if spreads.is_empty() {
        return Ok(None);
    }
    let derivatives = by_closed_form(scene)?;
    let part = |spread: &Spread| {
        let entry = derivatives.entries.iter().find(|entry| entry.parameter == spread.parameter);
        entry.and_then(|entry| Some(derivative(entry)? * entry.value * spread.relative)).unwrap_or(0.0)
    };
    Ok(Some(spreads.iter().map(|spread| part(spread).powi(2)).sum::<f64>().sqrt()))
}

/// Uncertainty of V_c from the spreads of its inputs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Uncertainty {
    /// The spreads, in the order given.
    pub spreads: Vec<Share>,
    /// Standard deviation to first order [m/s]: root of the sum of squares of elasticity times spread, times V_c.
    #[serde(rename = "first_order_m_s")]
    pub first_order: f64,
    /// Samples that had a critical velocity.
    pub samples: usize,
    /// Samples left out because the scene is not admissible (a nose factor above one, say), or plugs in several ranges of velocities.
    pub inadmissible: usize,
    /// Seed of the samples.
    pub seed: u64,
    /// Mean of the samples (m/s).
    #[serde(rename = "mean_m_s")]
    pub mean: f64,
    /// Standard deviation of the samples (m/s).
    #[serde(rename = "deviation_m_s")]
    pub deviation: f64,
    /// Quantiles 2.5, 50 and 97.5 % of the samples (m/s).
    #[serde(rename = "quantiles_m_s")]
    pub quantiles: [f64; 3],
    /// What a design may count on.
    pub design: Design,
}

/// A critical velocity that few targets fall short of, and the safety factor that leads there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Design {
    /// Share p of the samples that have a lower critical velocity.
    pub probability: f64,
    /// The sample of rank `n p`, rounded up (m/s).
    pub velocity_m_s: f64,
    /// 95 % interval of that quantile by the ranks of a binomial distribution; `null` where the samples are too few for an end.
    pub interval95_m_s: [Option<f64>; 2],
    /// V_c of the scene as it stands over that velocity.
    pub safety_factor: f64,
}

/// Ranks, from 1, between which the quantile p of `count` samples lies with 95 %: `P(B < l) <= 2.5 %`, `P(B >= u) <= 2.5 %`, B binomial.
///
/// `None` where there is no such rank.
fn ranks_of_quantile(count: usize, p: f64) -> [Option<usize>; 2] {
    /// Half the level that is left out.
    const TAIL: f64 = 0.025;
    let n = count as f64;
    let deviation = (n * p * (1.0 - p)).sqrt();
    // Twelve deviations about the mean: less than 1e-30 lies outside.
    let first = (n * p - 12.0 * deviation - 12.0).floor().max(0.0) as usize;
    let last = (n * p + 12.0 * deviation + 12.0).ceil().min(n) as usize;
    let ln_choose = |k: f64| libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
    let (mut below, mut low, mut high) = (0.0, None, None);
    for k in first..=last {
        // P(B < k) is `below` here.
        if below <= TAIL && k > 0 {
            low = Some(k);
        }
        if high.is_none() && below >= 1.0 - TAIL {
            high = Some(k);
        }
        below += (ln_choose(k as f64) + k as f64 * p.ln() + (n - k as f64) * (-p).ln_1p()).exp();
    }
    [low, high.filter(|rank| *rank <= count)]
}

/// How far the depths that ship lie from those of Eq. 14.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatterOfEq14 {
    /// Root mean square of the logarithm of the S that a depth shows over that of Eq. 14.
    pub relative: f64,
    /// Depths within the range of the fit, and no shallower than X/d = 0.5.
    pub shots: usize,
}

/// The scatter of Eq. 14 by the depths that ship, bias included.
pub fn scatter_of_eq14() -> ScatterOfEq14 {
    let depths = experiments::shipped().unwrap_or_default();
    let comparisons = experiments::compare(&depths, None, &[], &ClosedForm).unwrap_or_default();
    let within = comparisons.iter().filter(|comparison| comparison.experiment.is_in_range_of_fit());
    let logs: Vec<f64> = within.filter_map(|comparison| Some(resistance::shown_over_eq14(comparison)?.ln())).collect();
    let squares: f64 = logs.iter().map(|ln| ln * ln).sum();
    ScatterOfEq14 { relative: (squares / logs.len() as f64).sqrt(), shots: logs.len() }
}

/// A spread and its part in the uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Share {
    /// The spread.
    #[serde(flatten)]
    pub spread: Spread,
    /// Its share in the variance of V_c, to first order; they sum up to one.
    pub share: f64,
}

/// Samples per seed: a fixed unit of parallel work, so that results do not depend on the number of threads.
const CHUNK: usize = 4096;

/// The same where V_c of each takes some fifty flights.
const HALVED: usize = 8;

/// Uncertainty of V_c of `scene` from independent `spreads`: to first order, and by `samples` random scenes.
///
/// Each input is multiplied by a random factor of its [`Distribution`]. S is multiplied on top of what Eq. 14 makes of the strength. V_c of a sample is the exact one, or through the energy
/// method; of a scene that plugs it is found by halving, in some milliseconds, and the first order is by differences. The same seed gives the same numbers on any number of threads.
///
/// # Errors
/// [`StudyError`]: no critical velocity, a number that the scene lacks or that V_c does not depend on, or no
/// admissible sample at all.
///
/// `probability` is that of the design value, between zero and one.
pub fn uncertainty(
    scene: &Scene,
    spreads: &[Spread],
    samples: usize,
    seed: u64,
    probability: f64,
) -> Studied<Uncertainty> {
    if spreads.iter().any(|spread| spread.parameter == Parameter::Velocity) {
        return Err(ParameterError::NoInput(Parameter::Velocity).into());
    }
    // V_c depends on neither; a clone without a title allocates nothing.
    let base = Scene { title: None, velocity: None, ..scene.clone() };
    let mut ordered = spreads.to_vec();
    ordered.sort_by_key(|spread| spread.parameter);
    let wanted: Vec<_> = ordered.iter().map(|spread| spread.parameter).collect();
    for parameter in &wanted {
        parameter.get(&base)?;
    }
    let (critical, elasticities) = if base.plug.is_some() {
        by_differences(&base, &wanted)?
    } else {
        let derivatives = match closed_form_of(&base, Some(&wanted))? {
            full if full.entries.iter().any(|e| e.critical_velocity.is_some()) => full,
            _ => taylor_of(&base, Some(&wanted))?,
        };
        let critical = derivatives
            .quantities
            .critical_velocity
            .ok_or_else(|| StudyError::NoCritical(derivatives.notes.join("; ")))?;
        let of = |entry: &Sensitivity| {
            let elasticity = elasticity(entry.critical_velocity, Some(critical), entry.value);
            (entry.parameter, elasticity.unwrap_or(0.0))
        };
        (critical, derivatives.entries.iter().map(of).collect())
    };
    let mut shares = Vec::with_capacity(spreads.len());
    for spread in spreads {
        let entry = elasticities.iter().find(|(parameter, _)| *parameter == spread.parameter);
        let elasticity = entry.map_or(0.0, |(_, elasticity)| *elasticity);
        shares.push(Share { spread: *spread, share: (elasticity * spread.relative).powi(2) });
    }
    let variance: f64 = shares.iter().map(|share| share.share).sum();
    for share in shares.iter_mut().filter(|_| variance > 0.0) {
        share.share /= variance;
    }

    let size = if base.plug.is_some() { HALVED } else { CHUNK };
    let drawn: Vec<Option<f64>> = (0..samples.div_ceil(size))
        .into_par_iter()
        .flat_map_iter(|chunk| {
            let mut random = Random::for_part(seed, &format!("spread {chunk}"));
            let count = size.min(samples - chunk * size);
            (0..count).map(|_| sample(&base, &ordered, &mut random)).collect::<Vec<_>>()
        })
        .collect();
    let mut velocities: Vec<f64> = drawn.iter().copied().flatten().collect();
    if velocities.is_empty() {
        return Err(StudyError::NoCritical("no random scene was admissible".to_owned()));
    }
    velocities.par_sort_unstable_by(f64::total_cmp);
    let count = velocities.len() as f64;
    let mean = velocities.iter().sum::<f64>() / count;
    let squares: f64 = velocities.iter().map(|v| (v - mean) * (v - mean)).sum();
    let quantile = |share: f64| velocities[(share * (count - 1.0)).round() as usize];
    let ranked = |rank: usize| velocities[rank - 1];
    let design = ranked(((probability * count).ceil() as usize).clamp(1, velocities.len()));
    Ok(Uncertainty {
        design: Design {
            probability,
            velocity_m_s: design,
            interval95_m_s: ranks_of_quantile(velocities.len(), probability).map(|rank| rank.map(ranked)),
            safety_factor: critical / design,
        },
        spreads: shares,
        first_order: variance.sqrt() * critical,
        samples: velocities.len(),
        inadmissible: samples - velocities.len(),
        seed,
        mean,
        deviation: (squares / (count - 1.0).max(1.0)).sqrt(),
        quantiles: [quantile(0.025), quantile(0.5), quantile(0.975)],
    })
}

/// V_c of a scene that plugs, whose paths have no derivative where they cross, and its elasticities to `wanted` by differences.
///
/// One-sided at the end of the range of a number.
fn by_differences(scene: &Scene, wanted: &[Parameter]) -> Studied<(f64, Vec<(Parameter, f64)>)> {
    /// Relative step: V_c is found to 1e-13.
    const STEP: f64 = 1e-4;
    let taylor = Taylor::default();
    let critical = critical_velocity::of_scene(scene, &taylor)?.velocity;
    let beside = |parameter: Parameter, value: f64| {
        let mut other = scene.clone();
        parameter.set(&mut other, value).ok()?;
        Some((value, critical_velocity::of_scene(&other, &taylor).ok()?.velocity))
    };
    let elasticity_to = |&parameter: &Parameter| {
        let value = parameter.get(scene)?;
        let here = Some((value, critical));
        let side = |sign: f64| beside(parameter, value * (1.0 + sign * STEP)).or(here);
        let slope = match (side(-1.0), side(1.0)) {
            (Some((low, below)), Some((high, above))) if high != low => (above - below) / (high - low),
            _ => 0.0,
        };
        Ok((parameter, elasticity(Some(slope), Some(critical), value).unwrap_or(0.0)))
    };
    Ok((critical, wanted.iter().map(elasticity_to).collect::<Studied<_>>()?))
}

/// V_c of one random scene; `None` where it is not admissible, or several ranges of velocities perforate.
fn sample(base: &Scene, spreads: &[Spread], random: &mut Random) -> Option<f64> {
    let mut scene = base.clone();
    for Spread { parameter, relative, distribution } in spreads {
        let value = parameter.get(&scene).ok()? * distribution.factor(*relative, random);
        parameter.set(&mut scene, value).ok()?;
    }
    if scene.plug.is_some() {
        return critical_velocity::of_scene(&scene, &Taylor::default()).ok().map(|found| found.velocity);
    }
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
    use crate::exchange::scene_file::SHIPPED;
    use crate::physics::{Criterion, Stage};
    use crate::studies::random_scenes::Generator;
    use crate::testing::shipped;

    fn entry(all: &Sensitivities, parameter: Parameter) -> Sensitivity {
        *all.entries.iter().find(|e| e.parameter == parameter).unwrap()
    }

    #[test]
    fn the_problem_in_dual_numbers_has_the_values_of_the_plain_one() {
        for (name, _) in SHIPPED {
            let scene = shipped(name);
            let Some(speed) = scene.velocity else { continue };
            for parameter in Parameter::all_of(&scene) {
                // A quotient of dual numbers is a product with the reciprocal: an ulp apart.
                let dual = dual_problem(&scene, speed, parameter).unwrap().cast::<f64>();
                let plain = scene.resolve(speed).unwrap();
                let numbers = |problem: &Problem| -> Vec<f64> {
                    let of_stage = |law: &Stage| [law.static_force, law.stiffness, law.viscosity, law.drag, law.end];
                    problem.stages.iter().flat_map(of_stage).chain([problem.mass, problem.exit_depth]).collect()
                };
                // NaN: of a law of its own.
                let is_near = |(a, b): (&f64, &f64)| a == b || a.is_nan() && b.is_nan() || (a / b - 1.0).abs() < 4e-15;
                assert_eq!(dual.stages.len(), plain.stages.len());
                assert!(numbers(&dual).iter().zip(&numbers(&plain)).all(is_near), "{name} {parameter}: {dual:?}");
            }
        }
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
                Err(StudyError::Resolve(_)) => continue,
                other => other.unwrap(),
            };
            let integrated = by_taylor(&scene).unwrap();
            if let Some(difference) = exact.disagreement(&integrated) {
                assert!(difference < 1e-12, "{scene:?}: {difference:e}\n{exact:?}\n{integrated:?}");
                worst = worst.max(difference);
                compared += 1;
            }
        }
        assert!(compared >= 250 && worst > 0.0, "{compared} {worst:e}");
    }

    /// The claims `sensitivities` compare the methods on eight other scenes.
    #[cfg(feature = "diffsol")]
    #[test]
    fn forward_sensitivities_of_the_library_agree_to_1e_7() {
        let difference =
            |name: &str, other: &Sensitivities| by_diffsol(&shipped(name), 1e-10).unwrap().disagreement(other).unwrap();
        for name in ["jump", "jump-perforate", "graze"] {
            let exact = by_closed_form(&shipped(name)).unwrap();
            assert!(difference(name, &exact) < 1e-7, "{name}: {exact:?}");
            assert!(by_taylor(&shipped(name)).unwrap().disagreement(&exact).unwrap() < 1e-12, "{name}: {exact:?}");
        }
        assert!(difference("viscous", &by_taylor(&shipped("viscous")).unwrap()) < 1e-7);
    }

    /// Symmetric differences of the closed form: independent of every dual number, accurate to about 1e-9.
    #[test]
    fn derivatives_are_those_of_differences() {
        for name in [
            "paper-slab",
            "tunnel",
            "crater",
            "jump",
            "jump-perforate",
            "perforate",
            "layered",
            "forrestal-1994-shot-14",
        ] {
            let scene = shipped(name);
            let all = by_closed_form(&scene).unwrap();
            for e in &all.entries {
                let at = |factor: f64| {
                    let mut moved = scene.clone();
                    e.parameter.set(&mut moved, e.value * factor).unwrap();
                    let flight = Truth::of(&moved.problem().unwrap()).unwrap().flight;
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
    fn viscous_stages_have_derivatives_by_taylor_alone() {
        let scene = shipped("viscous");
        let exact = by_closed_form(&scene).unwrap();
        assert!(exact.entries.iter().all(|e| e.depth.is_none()));
        let integrated = by_taylor(&scene).unwrap();
        assert!(integrated.entries.iter().any(|e| e.depth.is_some_and(|d| d < 0.0)));
        assert_eq!(exact.disagreement(&integrated), None);
    }

    /// The strength of `tunnel` is stated with the S of Eq. 14: P as fc, and not as its root.
    #[test]
    fn a_stated_factor_does_not_follow_the_strength_though_it_is_that_of_eq_14() {
        let of = |scene: &Scene, derivatives: &Sensitivities| {
            let e = entry(derivatives, Parameter::Strength);
            elasticity(e.depth, derivatives.quantities.depth, Parameter::Strength.get(scene).unwrap()).unwrap()
        };
        let stated = shipped("tunnel");
        let mut left_out = stated.clone();
        let Resistance::Concrete(concrete) = &mut left_out.resistance else { unreachable!() };
        concrete.follows_eq14 = true;
        for (scene, expected) in [(&stated, -0.544_703), (&left_out, -0.272_351)] {
            for derivatives in [by_closed_form(scene).unwrap(), by_taylor(scene).unwrap()] {
                assert!((of(scene, &derivatives) - expected).abs() < 1e-6, "{}", of(scene, &derivatives));
            }
        }
    }

    #[test]
    fn of_very_many_stages_the_shared_numbers_have_derivatives_and_a_chosen_one_its_spread() {
        let stage = |index: u32| Stage { end: 1e-3 * f64::from(index + 1), ..Stage::tunnel(1e4, 0.1) };
        let stages: Vec<_> = (0..500).map(stage).collect();
        let scene = Scene {
            resistance: Resistance::Stages(stages),
            thickness: Some(0.5),
            velocity: Some(300.0),
            ..crate::testing::scene()
        };
        for derivatives in [by_closed_form(&scene).unwrap(), by_taylor(&scene).unwrap()] {
            let named: Vec<_> = derivatives.entries.iter().map(|e| e.parameter).collect();
            assert_eq!(named, [Parameter::Mass, Parameter::Thickness, Parameter::Velocity]);
            assert!(derivatives.notes[0].contains("left out"), "{:?}", derivatives.notes);
        }
        let spread = "stage.3.static_force=1%".parse().unwrap();
        assert!(uncertainty(&scene, &[spread], 2, 1, 0.05).unwrap().first_order > 0.0);
    }

    #[test]
    fn a_spread_is_of_an_input_of_v_c_and_there_once() {
        let texts = |all: &[&str]| spreads(&all.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>());
        let twice = texts(&["target.strength=2%", "projectile.mass=1%", "target.strength=0.02"]);
        assert_eq!(twice, Err(ParameterError::Twice(Parameter::Strength)));
        let two = texts(&["target.strength=2%", "impact.velocity=1%"]).unwrap();
        assert_eq!(
            uncertainty(&shipped("paper-slab"), &two, 10, 1, 0.05),
            Err(ParameterError::NoInput(Parameter::Velocity).into())
        );
        assert!(uncertainty(&shipped("paper-slab"), &two[..1], 10, 1, 0.05).is_ok());
    }

    #[test]
    fn monte_carlo_meets_first_order_for_small_spreads_and_repeats_itself() {
        let scene = shipped("paper-slab");
        let spreads = ["target.strength=2%", "projectile.mass=0.01", "resistance.S=0.02"].map(|s| s.parse().unwrap());
        let found = uncertainty(&scene, &spreads, 20_000, 7, 0.05).unwrap();
        assert_eq!((found.samples, found.inadmissible), (20_000, 0));
        // The deviation of 20,000 samples has a standard error of 0.5 %.
        assert!((found.deviation / found.first_order - 1.0).abs() < 0.02, "{found:?}");
        assert!((found.mean / critical_velocity::exact(&scene).unwrap() - 1.0).abs() < 1e-3);
        assert!((found.spreads.iter().map(|share| share.share).sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(found, uncertainty(&scene, &spreads, 20_000, 7, 0.05).unwrap());
        assert_ne!(found.mean, uncertainty(&scene, &spreads, 20_000, 8, 0.05).unwrap().mean);
    }

    /// The elasticities of V_c of a slab that does not plug, in dual numbers; N* = 1 has a difference to one side alone.
    #[test]
    fn elasticities_by_differences_are_those_of_dual_numbers() {
        let scene = shipped("paper-slab");
        let exact = by_closed_form(&scene).unwrap();
        let wanted = [Parameter::Strength, Parameter::Thickness, Parameter::Mass, Parameter::NoseFactor];
        let (critical, found) = by_differences(&scene, &wanted).unwrap();
        assert!((critical / critical_velocity::exact(&scene).unwrap() - 1.0).abs() < 1e-14);
        for ((parameter, found), tolerance) in found.into_iter().zip([1e-7, 1e-7, 1e-7, 1e-4]) {
            let entry = entry(&exact, parameter);
            let expected = elasticity(entry.critical_velocity, Some(critical), entry.value).unwrap();
            assert!((found - expected).abs() < tolerance, "{parameter}: {found} {expected}");
        }
    }

    /// The deviation of 60 samples has a standard error of 9 %.
    #[test]
    fn a_slab_that_plugs_has_an_uncertainty() {
        let scene = shipped("plug");
        let spreads = ["perforation.shear_strength=1%", "projectile.mass=1%"].map(|s| s.parse().unwrap());
        let found = uncertainty(&scene, &spreads, 60, 7, 0.05).unwrap();
        assert_eq!((found.samples, found.inadmissible), (60, 0));
        assert!((found.deviation / found.first_order - 1.0).abs() < 0.3, "{found:?}");
        // E_c, and not V_c, goes with the path: V_c as the root of 1/M but for drag.
        assert!(found.spreads.iter().all(|share| share.share > 0.1), "{found:?}");
        let again = || uncertainty(&scene, &spreads, 10, 7, 0.05).unwrap();
        assert_eq!(again(), again());
    }

    /// mpmath, 40 digits: sums of `binomial(n, k) p^k (1 - p)^(n - k)` up to 2.5 % from either end.
    #[test]
    fn ranks_of_a_quantile_are_those_of_the_binomial_distribution() {
        for (count, p, low, high) in RANKS {
            assert_eq!(ranks_of_quantile(count, p), [low, high], "{count} {p}");
        }
    }

    const RANKS: [(usize, f64, Option<usize>, Option<usize>); 5] = [
        (10, 0.5, Some(2), Some(9)),
        (10, 0.05, None, Some(3)),
        (100, 0.05, Some(1), Some(11)),
        (1000, 0.05, Some(37), Some(65)),
        (20_000, 0.1, Some(1917), Some(2085)),
    ];

    /// Of 20,000 samples moments have a standard error of 0.7 %; the uniform one has no tail beyond its ends.
    #[test]
    fn a_number_is_distributed_as_it_is_said_with_the_same_deviation() {
        for (name, kurtosis) in [("normal", 3.0), ("uniform", 1.8), ("lognormal", 3.0)] {
            let spread: Spread = format!("projectile.mass=2%:{name}").parse().unwrap();
            assert_eq!(spread.distribution.name(), name);
            let mut random = Random::for_part(3, name);
            let values: Vec<f64> = (0..20_000).map(|_| spread.distribution.factor(0.02, &mut random) - 1.0).collect();
            let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / 20_000.0;
            assert!((moment(2).sqrt() / 0.02 - 1.0).abs() < 0.02, "{name}");
            assert!((moment(4) / moment(2).powi(2) / kurtosis - 1.0).abs() < 0.08, "{name}: {}", moment(4));
            assert!(name != "uniform" || values.iter().all(|v| v.abs() <= 0.02 * 3.0_f64.sqrt()));
        }
        for text in ["projectile.mass=2%:gauss", "projectile.mass=2%:", "projectile.mass:normal"] {
            assert!(text.parse::<Spread>().is_err(), "{text}");
        }
    }

    /// mpmath, 40 digits: of each shipped depth in range, from X/d = 0.5, S by the inverse of Li & Chen's depth; the root mean square of
    /// `ln(S √fc/72)`.
    #[test]
    fn the_scatter_of_eq_14_is_that_of_the_depths_that_ship() {
        let ScatterOfEq14 { relative, shots } = scatter_of_eq14();
        assert_eq!(shots, 86);
        assert!((relative - 0.180_233_884_820_654_63).abs() < 1e-12, "{relative}");
        let spread: Spread = "eq14".parse().unwrap();
        assert_eq!((spread.parameter, spread.relative), (Parameter::StaticFactor, relative));
        let twice = spreads(&["eq14".to_owned(), "resistance.S=2%".to_owned()]);
        assert_eq!(twice, Err(ParameterError::Twice(Parameter::StaticFactor)));
    }

    /// With one lognormal number of which V_c goes as a power, quantiles are known: V_c of the crater as the root of 1/M.
    #[test]
    fn the_design_value_holds_the_quantile_and_the_safety_factor_leads_to_it() {
        let scene = shipped("paper-slab");
        let spread = ["projectile.mass=10%".parse().unwrap()];
        let found = uncertainty(&scene, &spread, 20_000, 7, 0.05).unwrap();
        let [low, high] = found.design.interval95_m_s.map(Option::unwrap);
        let mut heavy = scene.clone();
        Parameter::Mass.set(&mut heavy, 20.0 * (0.1 * 1.644_853_626_951_472_7_f64).exp()).unwrap();
        let exact = critical_velocity::exact(&heavy).unwrap();
        assert!(low <= exact && exact <= high && high - low < 0.01 * exact, "{low} {exact} {high}");
        let critical = critical_velocity::exact(&scene).unwrap();
        assert!((found.design.safety_factor * found.design.velocity_m_s / critical - 1.0).abs() < 1e-15);
        assert!(uncertainty(&scene, &spread, 10, 7, 0.05).unwrap().design.interval95_m_s[0].is_none());
    }

    #[test]
    fn samples_beyond_the_admissible_are_counted_and_left_out() {
        let scene = shipped("paper-slab");
        let spreads = ["projectile.nose.factor=0.1".parse().unwrap()];
        let found = uncertainty(&scene, &spreads, 1000, 1, 0.05).unwrap();
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
            assert!(matches!(text.parse::<Spread>(), Err(ParameterError::Spread(_))), "{text}");
        }
        assert!(matches!("H/d=0.1".parse::<Spread>(), Err(ParameterError::Group(_))));
        assert_eq!("projectile.mass=5 %".parse::<Spread>().unwrap().relative, 0.05);
    }
}
