//! Residual velocities, ballistic limits and outcomes of tests beside those of the model.
//!
//! A target of thickness H is perforated at x = H, or as the row's criterion says. Shots of one set, projectile and thickness make a
//! group, and a group with enough of them has a ballistic limit of its own ([`ballistic_limit`](super::ballistic_limit)).

use serde::Serialize;

use super::PredictionError;
use super::ballistic_limit::{OutcomeFit, ResidualFit, of_outcomes, of_residuals};
use super::shot::{Measured, Shot};
use super::statistics::Sample;
use crate::integrators::{ClosedForm, Detail, Integrator};
use crate::physics::{Outcome, Scene};
use crate::studies::critical_velocity;
use crate::studies::error::{Studied, StudyError};
use crate::studies::experiments::grouped;
use crate::studies::sensitivity::{Sensitivity, Spread, input_uncertainty};

/// A shot at a target with a far side, beside its prediction.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct PerforationTest {
    /// Set.
    pub set: String,
    /// Line in its file, from 1.
    pub line: u64,
    /// Impact velocity (m/s).
    pub velocity_m_s: f64,
    /// Thickness (m).
    pub thickness_m: f64,
    /// Whether it perforated.
    pub measured_perforation: bool,
    /// Whether the model perforates; `null` where that is undecided.
    pub predicted_perforation: Option<bool>,
    /// Measured residual velocity (m/s).
    pub measured_velocity_m_s: Option<f64>,
    /// Predicted residual velocity (m/s), zero for a stop.
    pub predicted_velocity_m_s: f64,
    /// E = S - D of the residual velocity (m/s), where it was measured.
    pub comparison_error_m_s: Option<f64>,
    /// Numerical uncertainty of the prediction (m/s).
    pub numerical_uncertainty_m_s: f64,
    /// Uncertainty by the spreads of inputs (m/s); `null` where none is stated, or the outcomes differ.
    pub input_uncertainty_m_s: Option<f64>,
    /// Standard uncertainty of the measurement (m/s).
    pub data_uncertainty_m_s: Option<f64>,
    /// `u_val` (m/s); `null`, not given, without the two above.
    pub validation_uncertainty_m_s: Option<f64>,
    /// What of the shot lies outside the experiments of Eq. 14.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "report", schemars(default))]
    pub outside_eq14: Vec<String>,
}

/// A measured ballistic limit beside V_c of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct LimitTest {
    /// Set.
    pub set: String,
    /// Line in its file, from 1.
    pub line: u64,
    /// Thickness (m).
    pub thickness_m: f64,
    /// Measured limit (m/s).
    pub measured_limit_m_s: f64,
    /// Interval of the measured limit (m/s): as given, or two standard uncertainties to either side.
    pub interval_m_s: Option<[f64; 2]>,
    /// Critical velocity of the model (m/s).
    pub predicted_limit_m_s: f64,
    /// Predicted over measured limit.
    pub ratio: f64,
    /// Whether the prediction lies in the interval; `null` without one.
    pub within_interval: Option<bool>,
}

/// Shots of one set, diameter, nose and thickness.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Group {
    /// Set.
    pub set: String,
    /// Diameter (m).
    pub diameter_m: f64,
    /// Thickness (m).
    pub thickness_m: f64,
    /// Least and greatest mass (kg).
    pub mass_kg: [f64; 2],
    /// Least and greatest strength (Pa).
    pub strength_pa: [f64; 2],
    /// Shots.
    pub shots: usize,
    /// Lines of the shots in their file, from 1.
    pub lines: Vec<u64>,
    /// Mean of V_c of the model over the shots (m/s).
    pub predicted_limit_m_s: f64,
    /// Curve through the residual velocities with p = 2.
    pub recht_ipson: Option<ResidualFit>,
    /// Curve with p free.
    pub lambert_jonas: Option<ResidualFit>,
    /// Limit by outcomes.
    pub outcomes: Option<OutcomeFit>,
}

/// How shots at targets with a far side came out, set by set.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct PerforationSummary {
    /// Set.
    pub set: String,
    /// Shots with an outcome.
    pub shots: usize,
    /// Outcome as predicted.
    pub right: usize,
    /// The model perforates, the shot did not.
    pub model_only: usize,
    /// The shot perforated, the model does not.
    pub test_only: usize,
    /// The model leaves it undecided.
    pub undecided: usize,
    /// E = S - D of residual velocities (m/s).
    pub residual_error_m_s: Option<Sample>,
    /// Residual velocities with u_val.
    pub with_validation_uncertainty: usize,
    /// Of these, |E| <= u_val.
    pub within_validation_uncertainty: usize,
}

/// All that is said of perforation.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Perforations {
    /// Sets.
    pub sets: Vec<PerforationSummary>,
    /// Shots with an outcome at a target of known thickness.
    pub shots: Vec<PerforationTest>,
    /// Ballistic limits.
    pub limits: Vec<LimitTest>,
    /// Groups with a limit of their own.
    pub groups: Vec<Group>,
}

impl Perforations {
    /// True if no shot says anything of perforation.
    pub fn is_empty(&self) -> bool {
        self.shots.is_empty() && self.limits.is_empty()
    }

    /// What `shots` say, excluded ones left out, with `crater_ratio` in place of theirs where it is given.
    ///
    /// # Errors
    /// [`PredictionError`] of the first shot without a prediction.
    pub fn of(
        shots: &[Shot],
        crater_ratio: Option<f64>,
        spreads: &[Spread],
        integrator: &dyn Integrator,
    ) -> Result<Self, PredictionError> {
        let used = || shots.iter().filter(|shot| shot.excluded.is_none() && shot.scene.thickness.is_some());
        let named = |shot: &Shot, cause: StudyError| PredictionError {
            set: shot.set.clone(),
            line: shot.line,
            cause: Box::new(cause),
        };
        let (mut tests, mut limits) = (Vec::new(), Vec::new());
        for shot in used() {
            let scene = shot.scene(crater_ratio);
            if let Some(perforated) = shot.perforated {
                tests.push(test(shot, &scene, perforated, spreads, integrator).map_err(|cause| named(shot, cause))?);
            }
            if let Some(limit) = shot.limit {
                let found =
                    critical_velocity::of_scene(&scene, integrator).map_err(|cause| named(shot, cause.into()))?;
                let interval_m_s = shot.limit_interval;
                let predicted = found.velocity;
                limits.push(LimitTest {
                    set: shot.set.clone(),
                    line: shot.line,
                    thickness_m: scene.thickness.unwrap_or(f64::INFINITY),
                    measured_limit_m_s: limit.value,
                    interval_m_s,
                    predicted_limit_m_s: predicted,
                    ratio: predicted / limit.value,
                    within_interval: interval_m_s.map(|[low, high]| (low..=high).contains(&predicted)),
                });
            }
        }
        let fired: Vec<&Shot> = used().filter(|shot| shot.perforated.is_some()).collect();
        let groups = grouped(fired, |shot| shot.key()).into_iter();
        let groups = groups
            .filter_map(|(_, members)| group(&members, crater_ratio, integrator).transpose())
            .collect::<Result<_, _>>()?;
        let sets = grouped(&tests, |test: &&PerforationTest| test.set.clone()).into_iter().map(summary).collect();
        Ok(Self { sets, shots: tests, limits, groups })
    }
}

fn test(
    shot: &Shot,
    scene: &Scene,
    measured_perforation: bool,
    spreads: &[Spread],
    integrator: &dyn Integrator,
) -> Studied<PerforationTest> {
    let problem = scene.problem()?;
    let flight = integrator.solve(&problem, Detail::End)?;
    let residual = |outcome: Outcome, velocity: f64| if outcome == Outcome::Perforated { velocity } else { 0.0 };
    let predicted = residual(flight.outcome, flight.end.velocity);
    let exact = ClosedForm.solve(&problem, Detail::End)?;
    let numerical = (predicted - residual(exact.outcome, exact.end.velocity)).abs().max(f64::EPSILON * predicted);
    let measured = shot.residual.map(|Measured { value, .. }| value);
    let data = shot.residual.and_then(|residual| residual.uncertainty);
    let is_perforation = measured_perforation && flight.outcome == Outcome::Perforated;
    let input = if is_perforation && measured.is_some() {
        input_uncertainty(scene, spreads, |entry: &Sensitivity| entry.velocity)?
    } else {
        None
    };
    Ok(PerforationTest {
        set: shot.set.clone(),
        line: shot.line,
        velocity_m_s: problem.impact_speed,
        thickness_m: scene.thickness.unwrap_or(f64::INFINITY),
        measured_perforation,
        predicted_perforation: (flight.outcome != Outcome::Undecided).then_some(flight.outcome == Outcome::Perforated),
        measured_velocity_m_s: measured,
        predicted_velocity_m_s: predicted,
        comparison_error_m_s: measured.map(|measured| predicted - measured),
        numerical_uncertainty_m_s: numerical,
        input_uncertainty_m_s: input,
        data_uncertainty_m_s: data,
        validation_uncertainty_m_s: data.zip(input).map(|(data, input)| numerical.hypot(data).hypot(input)),
        outside_eq14: shot.outside_eq14(),
    })
}

fn summary((set, members): (String, Vec<&PerforationTest>)) -> PerforationSummary {
    let count = |measured: bool, predicted: Option<bool>| {
        members
            .iter()
            .filter(|test| (test.measured_perforation, test.predicted_perforation) == (measured, predicted))
            .count()
    };
    let errors: Vec<f64> = members.iter().filter_map(|test| test.comparison_error_m_s).collect();
    let judged =
        || members.iter().filter_map(|test| Some((test.comparison_error_m_s?, test.validation_uncertainty_m_s?)));
    PerforationSummary {
        shots: members.len(),
        right: count(true, Some(true)) + count(false, Some(false)),
        model_only: count(false, Some(true)),
        test_only: count(true, Some(false)),
        undecided: count(true, None) + count(false, None),
        residual_error_m_s: Sample::of(&errors),
        with_validation_uncertainty: judged().count(),
        within_validation_uncertainty: judged().filter(|(error, bound)| error.abs() <= *bound).count(),
        set,
    }
}

/// The group of `members`, at least one; `None` where neither residual velocities nor outcomes give a limit.
fn group(
    members: &[&Shot],
    crater_ratio: Option<f64>,
    integrator: &dyn Integrator,
) -> Result<Option<Group>, PredictionError> {
    let speed = |shot: &Shot| shot.scene.velocity.unwrap_or(0.0);
    let residuals: Vec<(f64, f64)> = members
        .iter()
        .filter(|shot| shot.perforated == Some(true))
        .filter_map(|shot| Some((speed(shot), shot.residual?.value)))
        .collect();
    let outcomes: Vec<(f64, bool)> = members.iter().filter_map(|shot| Some((speed(shot), shot.perforated?))).collect();
    let ([recht_ipson, lambert_jonas], outcomes) = (of_residuals(&residuals), of_outcomes(&outcomes));
    if recht_ipson.is_none() && lambert_jonas.is_none() && outcomes.is_none() {
        return Ok(None);
    }
    let mut limits = Vec::new();
    for shot in members {
        let found = critical_velocity::of_scene(&shot.scene(crater_ratio), integrator);
        let found = found.map_err(|cause| PredictionError {
            set: shot.set.clone(),
            line: shot.line,
            cause: Box::new(cause.into()),
        })?;
        limits.push(found.velocity);
    }
    let range = |number: fn(&Shot) -> f64| {
        let values = || members.iter().map(|shot| number(shot));
        [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
    };
    let Shot { set, scene, .. } = members[0];
    Ok(Some(Group {
        set: set.clone(),
        diameter_m: scene.concrete().map_or(f64::NAN, |concrete| concrete.diameter),
        thickness_m: scene.thickness.unwrap_or(f64::INFINITY),
        mass_kg: range(|shot| shot.scene.mass),
        strength_pa: range(|shot| shot.scene.concrete().map_or(f64::NAN, |concrete| concrete.strength)),
        shots: members.len(),
        lines: members.iter().map(|shot| shot.line).collect(),
        predicted_limit_m_s: limits.iter().sum::<f64>() / limits.len() as f64,
        recht_ipson,
        lambert_jonas,
        outcomes,
    }))
}
