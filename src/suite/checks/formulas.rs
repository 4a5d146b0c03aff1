//! Eq. 11-12 and 15 beside the equation of motion (theory sections 3 and 4).

use super::super::claim::{Claim, Eq15Form, Evidence, Measurement, NotMeasured};
use super::super::verdict::Verdict;
use super::{Context, build};
use crate::integrators::Detail;
use crate::integrators::method::MethodOptions;
use crate::physics::nose::NoseShape;
use crate::physics::semi_empirical::{
    NDRC_END, NDRC_FIRST_BRANCH_END, depth_ratio, eq15_printed, eq15_unrounded, jumps, model_difference,
};
use crate::physics::{Concrete, CraterStiffness, Criterion, Scene, groups};
use crate::studies::critical_velocity;
use crate::studies::order::{StepError, fit};
use crate::studies::random::Random;

/// Diameter, mass, strength and S of the formulas' scenes: any will do, the groups alone matter.
const MASS: f64 = 2.0;

/// A concrete scene of given N (`None`: Q = 0), continuous c and k = 2.
fn scene(geometry: Option<f64>) -> (Scene, Concrete) {
    let mut concrete = Concrete {
        diameter: 0.05,
        nose_factor: 1.0,
        strength: 36e6,
        density: 0.0,
        static_factor: 12.0,
        inertia_factor: 1.0,
        crater_ratio: 2.0,
        crater_stiffness: CraterStiffness::Continuous,
        layers: Vec::new(),
    };
    if let Some(n) = geometry {
        concrete.density = groups::density_for(n, MASS, &concrete);
    }
    (Scene::of_concrete(MASS, concrete.clone()), concrete)
}

/// X/d by the claim's method at impact function `impact`.
pub(super) fn flown_depth_ratio(claim: &Claim, geometry: Option<f64>, impact: f64) -> Result<f64, NotMeasured> {
    let (scene, concrete) = scene(geometry);
    let method = build(claim.method.unwrap_or_default(), &MethodOptions::default())?;
    let speed = groups::impact_speed_for(impact, MASS, &concrete);
    let problem = scene.resolve(speed).map_err(NotMeasured::broken)?;
    let flight = super::fly(&method, &problem, Detail::End)?;
    Ok(flight.end.depth / concrete.diameter)
}

/// N* against `8 ∫ y sin²(angle) dy` over the radius, and the height against the circle of the nose.
///
/// In the radius y the integrand is a cubic for every shape, which Simpson's rule integrates exactly; `sin²` of the angle
/// between axis and tangent comes from the normal of the circle.
pub(super) fn nose() -> Result<Measurement, NotMeasured> {
    let integral = |sine_squared: &dyn Fn(f64) -> f64| {
        let f = |y: f64| 8.0 * y * sine_squared(y);
        (f(0.0) + 4.0 * f(0.25) + f(0.5)) * 0.5 / 6.0
    };
    let mut worst = (0.0_f64, String::new());
    let mut take = |shape: NoseShape, found: f64, exact: f64| {
        let error = (found / exact - 1.0).abs();
        if error.is_nan() || error > worst.0 {
            worst = (error, format!("{shape:?}"));
        }
    };
    for psi in [0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.25, 6.0] {
        let ogive = NoseShape::Ogive { caliber_radius_head: psi };
        take(ogive, ogive.factor(), integral(&|y| 1.0 - ((y + psi - 0.5) / psi).powi(2)));
        let cone = NoseShape::Cone { length_ratio: psi };
        take(cone, cone.factor(), integral(&|_| 0.25 / (0.25 + psi * psi)));
        let cap = NoseShape::Spherical { radius_ratio: psi };
        take(cap, cap.factor(), integral(&|y| 1.0 - (y / psi).powi(2)));
        // Tip and shoulder lie on one circle: about the foot psi - 1/2 beyond the axis, or the centre of the sphere.
        let (h, foot) = (ogive.height_ratio(), psi - 0.5);
        take(ogive, (h * h + foot * foot).sqrt(), psi);
        let h = cap.height_ratio();
        take(cap, (0.25 + (psi - h) * (psi - h)).sqrt(), psi);
        if h > psi {
            return Err(NotMeasured::broken(format!("a cap of radius {psi} d cannot be {h} d high")));
        }
    }
    take(NoseShape::Flat, NoseShape::Flat.factor(), 1.0);
    Ok(Measurement::new(worst.0).remark(format!("worst: {}", worst.1)))
}

/// Q = 0 and continuous c: X/d against Eq. 11-12.
pub(super) fn small_impact(
    claim: &Claim,
    context: Context<'_>,
    (from, to): (f64, f64),
    points: usize,
) -> Result<Measurement, NotMeasured> {
    let mut random = Random::for_part(context.seed, &claim.id);
    let mut worst = (0.0_f64, 0.0);
    for index in 0..points {
        let impact = match index {
            0 => from,
            1 => to,
            2 => std::f64::consts::FRAC_PI_2,
            _ => random.log_uniform(from, to),
        };
        let ours = flown_depth_ratio(claim, None, impact)?;
        let error = (ours / depth_ratio(impact, 2.0) - 1.0).abs();
        if error.is_nan() || error > worst.0 {
            worst = (error, impact);
        }
    }
    Ok(Measurement::new(worst.0).remark(format!("worst at I = {:.4e}", worst.1)))
}

/// Geometry functions of the approach: far enough for the first term to rule, not so far that it drowns.
const GEOMETRY: [f64; 2] = [1e4, 1e7];

/// Errors of Eq. 11-12 over 1/N at fixed I.
fn approach(claim: &Claim, impact: f64) -> Result<Vec<StepError>, NotMeasured> {
    const POINTS: usize = 40;
    let mut random = Random::for_part(1, &claim.id);
    let limit = depth_ratio(impact, 2.0);
    (0..POINTS)
        .map(|_| {
            let n = random.log_uniform(GEOMETRY[0], GEOMETRY[1]);
            let x = flown_depth_ratio(claim, Some(n), impact)?;
            Ok(StepError::new(1.0 / n, x - limit))
        })
        .collect()
}

/// Distance of the order of the approach in 1/N from 1.
pub(super) fn approach_order(claim: &Claim, impact: f64) -> Result<Measurement, NotMeasured> {
    let fit = fit(&approach(claim, impact)?).map_err(NotMeasured::broken)?;
    let Some(line) = fit.line else {
        return Ok(Measurement::new(f64::NAN).verdict(Verdict::Undecided).remark(fit.reason));
    };
    let half_width = 0.5 * (line.interval95[1] - line.interval95[0]);
    Ok(Measurement::new((line.order - 1.0).abs())
        .resolution(half_width)
        .remark(format!("order {:.5} in 1/N at I = {impact}", line.order))
        .evidence(Evidence::Fit { abscissa: "1/N", formal: 1.0, fit: Box::new(fit) }))
}

/// Relative distance of the constant of the approach from theory section 3.
pub(super) fn approach_constant(claim: &Claim, impact: f64) -> Result<Measurement, NotMeasured> {
    // (X(N) - limit) N = C + C'/N: two geometry functions extrapolate C' away.
    let n = 1e5;
    let limit = depth_ratio(impact, 2.0);
    let at = |n: f64| -> Result<f64, NotMeasured> { Ok((flown_depth_ratio(claim, Some(n), impact)? - limit) * n) };
    let measured = 2.0 * at(2.0 * n)? - at(n)?;
    // The stated first-order difference is relative to X/d, and per 1/N.
    let predicted = model_difference(impact, 1.0, 2.0) * limit;
    Ok(Measurement::new((measured / predicted - 1.0).abs())
        .remark(format!("(X/d - limit) N = {measured:.9}, predicted {predicted:.9}")))
}

/// E_c/(d³ fc S) of Eq. 11-12 (k = 2) with the ACE/NDRC relation, each branch with its coefficients spelled out.
///
/// Written here once more, apart from the crate's formula: the plain form, which cancels for small H/d.
fn composed(thickness_ratio: f64) -> f64 {
    use std::f64::consts::PI;
    let h = thickness_ratio;
    let y = 3.19 / 1.436;
    if h <= 3.19 * 1.35 - 0.718 * 1.35 * 1.35 {
        PI / 16.0 * (y - (y * y - h / 0.718).sqrt()).powi(2)
    } else if h <= 3.8 {
        PI / (16.0 * 1.24 * 1.24) * (h - 1.32).powi(2)
    } else {
        PI / (4.0 * 1.24) * (h - 2.56)
    }
}

/// Eq. 15 against its two parents over H/d.
#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
pub(super) fn eq15(form: Eq15Form, from: f64, to: f64) -> Result<Measurement, NotMeasured> {
    const POINTS: usize = 2000;
    let formula = match form {
        Eq15Form::Printed => eq15_printed,
        Eq15Form::Unrounded => eq15_unrounded,
    };
    let mut worst = (0.0_f64, 0.0);
    for index in 0..POINTS {
        let ratio = from * (to / from).powf(index as f64 / (POINTS - 1) as f64);
        let error = (formula(ratio) / composed(ratio) - 1.0).abs();
        if error.is_nan() || error > worst.0 {
            worst = (error, ratio);
        }
    }
    Ok(Measurement::new(worst.0).remark(format!("worst at H/d = {:.4}", worst.1)))
}

/// Distance of a jump of Eq. 15 from the stated one.
pub(super) fn eq15_jump(form: Eq15Form, at: f64, stated: f64) -> Result<Measurement, NotMeasured> {
    let formula = match form {
        Eq15Form::Printed => eq15_printed,
        Eq15Form::Unrounded => eq15_unrounded,
    };
    // The branches are closed to the left (H/d <= 3.0), so one ulp to the right is the next branch.
    let jump = formula(at.next_up()) - formula(at);
    let listed = jumps().iter().any(|j| (j.thickness_ratio - at).abs() < 1e-9);
    if !listed && form == Eq15Form::Printed {
        return Err(NotMeasured::broken(format!("no joint at H/d = {at}")));
    }
    Ok(Measurement::new((jump - stated).abs()).remark(format!("jump {jump:+.9} S at H/d = {at}")))
}

/// V_c with the NDRC criterion, Q = 0 and continuous c, against unrounded Eq. 15 for H/d in (0, 18.06], the ends of the
/// branches and their neighbours among them.
pub(super) fn ndrc_criterion(claim: &Claim, context: Context<'_>, points: usize) -> Result<Measurement, NotMeasured> {
    let (mut scene, concrete) = scene(None);
    scene.criterion = Criterion::Ndrc;
    let method = build(claim.method.unwrap_or_default(), &MethodOptions::default())?;
    let mut random = Random::for_part(context.seed, &claim.id);
    let joints = [2.994, NDRC_FIRST_BRANCH_END, 3.0, 3.8]
        .into_iter()
        .flat_map(|joint: f64| [joint.next_down(), joint, joint.next_up()])
        .chain([1e-3, NDRC_END]);
    let drawn = std::iter::repeat_with(|| random.log_uniform(1e-2, NDRC_END));
    let mut worst = (0.0_f64, 0.0);
    for ratio in joints.chain(drawn).take(points) {
        scene.thickness = Some(ratio * concrete.diameter);
        let found = critical_velocity::of_scene(&scene, method.integrator()).map_err(NotMeasured::broken)?;
        // From the thickness that the scene holds, which rounds H/d.
        let ratio = ratio * concrete.diameter / concrete.diameter;
        let ours = groups::dimensionless_energy(found.energy, &concrete) / concrete.static_factor;
        let error = (ours / eq15_unrounded(ratio) - 1.0).abs();
        if error.is_nan() || error > worst.0 {
            worst = (error, ratio);
        }
    }
    Ok(Measurement::new(worst.0).remark(format!("{points} thicknesses, worst at H/d = {:.4}", worst.1)))
}
