//! What stands between the equation and its use: sweeps, the map of Eq. 11-12, measured depths, sensitivities.

use super::super::claim::{Claim, Evidence, Measurement, NotMeasured};
use super::{Subject, build, formulas};
use crate::integrators::MethodName;
use crate::integrators::method::MethodOptions;
use crate::physics::groups::dimensionless_energy;
use crate::physics::{Criterion, Scene, semi_empirical};
use crate::studies::parameter::Parameter;
use crate::studies::sensitivity::{self, Sensitivities, SensitivityError};
use crate::studies::sweep::{Axis, Plan};
use crate::studies::{applicability, critical_velocity, experiments};

/// A maximum that keeps a NaN, and where it was found.
#[derive(Default)]
struct Worst {
    value: f64,
    place: String,
}

impl Worst {
    fn take(&mut self, value: f64, place: impl FnOnce() -> String) {
        if !(value <= self.value) {
            (self.value, self.place) = (value, place());
        }
    }

    fn measurement(self) -> Measurement {
        let remark = if self.place.is_empty() { String::new() } else { format!("worst {}", self.place) };
        Measurement::new(self.value).remark(remark)
    }
}

/// Every point of a sweep of H/d against the closed form of a scene that is built here, by both criteria.
pub(super) fn sweep(subject: &Subject<'_>, [from, to]: [f64; 2], points: usize) -> Result<Measurement, NotMeasured> {
    let axis = Axis { parameter: Parameter::ThicknessRatio, from, to, count: points, logarithmic: false };
    let plan = Plan::new(subject.scene.clone(), &[axis]).map_err(NotMeasured::broken)?;
    let concrete = subject.scene.concrete().ok_or_else(|| NotMeasured::skip("the scene is not of concrete"))?;
    let method = subject.method(None)?;
    let rows = plan.run(method.integrator());
    let mut worst = Worst::default();
    for (index, row) in rows.iter().enumerate() {
        if !row.error.is_empty() {
            return Err(NotMeasured::broken(format!("point {index}: {}", row.error)));
        }
        let ratio = from + (to - from) * index as f64 / (points - 1) as f64;
        let by = |criterion| -> Result<(f64, f64), NotMeasured> {
            let thickness = Some(ratio * concrete.diameter);
            let scene = Scene { thickness, criterion, ..subject.scene.clone() };
            let velocity = critical_velocity::exact(&scene).map_err(NotMeasured::broken)?;
            Ok((velocity, dimensionless_energy(0.5 * scene.mass * velocity * velocity, concrete)))
        };
        let (full, ndrc) = (by(Criterion::FullDepth)?, by(Criterion::Ndrc)?);
        let own = if subject.scene.criterion == Criterion::Ndrc { ndrc } else { full };
        for (found, exact) in [
            (row.critical_velocity, own.0),
            (row.dimensionless_energy, own.1),
            (row.energy_full_depth, full.1),
            (row.energy_ndrc, ndrc.1),
        ] {
            worst.take((found.unwrap_or(f64::NAN) / exact - 1.0).abs(), || format!("at H/d = {ratio:.4}"));
        }
    }
    Ok(worst.measurement().evidence(Evidence::Sweep { plan: Box::new(plan), rows }))
}

/// Depth flown at places of each line of equal error, k = 2: Eq. 11-12 must be off it by just that error.
pub(super) fn map(claim: &Claim, points: usize) -> Result<Measurement, NotMeasured> {
    const CRATER_RATIO: f64 = 2.0;
    let lines = applicability::lines(CRATER_RATIO);
    let mut worst = Worst::default();
    for line in &lines {
        for index in 0..points {
            let (impact, geometry) = line.points[index * (line.points.len() - 1) / (points - 1).max(1)];
            let flown = formulas::flown_depth_ratio(claim, Some(geometry), impact)?;
            let error = semi_empirical::depth_ratio(impact, CRATER_RATIO) / flown - 1.0;
            worst.take((error.abs() / line.level - 1.0).abs(), || {
                format!("on the line of {} at I = {impact:.4}, N = {geometry:.4}", line.level)
            });
        }
    }
    let shots = experiments::shipped().map_err(NotMeasured::broken)?;
    let scenes = experiments::marked(&shots);
    Ok(worst.measurement().evidence(Evidence::Map { crater_ratio: CRATER_RATIO, lines, scenes }))
}

/// Worst distance from 1 of the median of predicted over measured depth, over the sets of deep shots.
pub(super) fn measured_depth(claim: &Claim) -> Result<Measurement, NotMeasured> {
    let method = build(claim.method.unwrap_or_default(), &MethodOptions::default())?;
    let shots = experiments::shipped().map_err(NotMeasured::broken)?;
    let comparisons = experiments::compare(&shots, None, &[], method.integrator()).map_err(NotMeasured::broken)?;
    let deep: Vec<_> = comparisons.iter().filter(|c| !c.is_shallow()).cloned().collect();
    let mut worst = Worst::default();
    for set in experiments::summaries(&deep) {
        worst.take((set.median - 1.0).abs(), || {
            format!("{}: median {:.3} of {} shots", set.group, set.median, set.shots)
        });
    }
    Ok(worst.measurement().evidence(Evidence::Depths(comparisons)))
}

/// Elasticities by the claim's method against those of the closed form.
pub(super) fn sensitivities(subject: &Subject<'_>) -> Result<Measurement, NotMeasured> {
    let exact = sensitivity::by_closed_form(subject.scene).map_err(NotMeasured::broken)?;
    let found = match subject.method_name() {
        MethodName::Taylor => sensitivity::by_taylor(subject.scene),
        MethodName::Tsit45 => by_library(subject.scene)?,
        other => return Err(NotMeasured::skip(format!("{other} has no sensitivities"))),
    }
    .map_err(NotMeasured::broken)?;
    let difference = exact
        .disagreement(&found)
        .ok_or_else(|| NotMeasured::skip("no quantity of the scene has a derivative in closed form"))?;
    Ok(Measurement::new(difference).remark(format!("{} numbers", exact.entries.len())))
}

#[cfg(feature = "diffsol")]
#[expect(clippy::unnecessary_wraps, reason = "the build without the library has an answer of its own")]
fn by_library(scene: &Scene) -> Result<Result<Sensitivities, SensitivityError>, NotMeasured> {
    Ok(sensitivity::by_diffsol(scene, 1e-10))
}

#[cfg(not(feature = "diffsol"))]
fn by_library(_: &Scene) -> Result<Result<Sensitivities, SensitivityError>, NotMeasured> {
    Err(NotMeasured::skip(format!("this build leaves out {}", MethodName::Tsit45)))
}
