//! Eq. 11-12 and 15 beside the equation of motion (docs/theory.md, sections 3 and 4).

use schemars::JsonSchema;
use serde::Deserialize;

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::{Subject, Worst, half_width, off, solve};
use crate::integrators::Detail;
use crate::physics::nose::NoseShape;
use crate::physics::semi_empirical::{
    NDRC_END, NDRC_FIRST_BRANCH_END, depth_ratio, eq15_printed, eq15_unrounded, jumps, model_difference,
};
use crate::physics::{Concrete, Criterion, Scene, groups};
use crate::studies::critical_velocity;
use crate::studies::edge_problems::concrete;
use crate::studies::order::{StepError, fit};
use crate::studies::random::Random;

check! {
    /// N* and height of every nose shape against the integral and the circle that they stand for; worst relative
    /// difference.
    Nose {} in Exact, "relative", by nose, compares (Formulas | Itself);
    /// Method at Q = 0 and continuous c against Eq. 11-12, `points` impact functions I from `from` to `to`; worst
    /// relative difference of X/d.
    SmallImpact {
        /// Smallest I.
        from: f64,
        /// Largest I.
        to: f64,
        /// How many, log-uniform from the seed.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        points: usize,
    } in Exact, "relative", by small_impact, compares (Method | Formulas);
    /// X/d at finite N against Eq. 11-12 as N grows: distance of the fitted order in 1/N from 1.
    ApproachOrder {
        /// Impact function I; its side of k pi/4 decides between Eq. 11 and Eq. 12.
        impact: f64,
    } in Exact, "order", by approach_order, compares (Method | Formulas);
    /// The same: relative distance of the constant from docs/theory.md, section 3.
    ApproachConstant {
        /// Impact function I.
        impact: f64,
    } in Exact, "relative", by approach_constant, compares (Method | Formulas);
    /// Eq. 15 against Eq. 11-12 with the ACE/NDRC relation over H/d; worst relative difference.
    Eq15 {
        /// `unrounded` or `printed`.
        form: Eq15Form,
        /// Smallest H/d.
        from: f64,
        /// Largest H/d.
        to: f64,
    } in Exact, "relative", by eq15, compares (Formulas | Itself);
    /// Jump of Eq. 15 at a joint, in units of S: distance from the stated one.
    Eq15Jump {
        /// `unrounded` or `printed`.
        form: Eq15Form,
        /// The joint H/d.
        at: f64,
        /// Stated jump in units of S.
        jump: f64,
    } in Exact, "S", by eq15_jump, compares (Formulas | Elsewhere);
    /// Critical velocity with the NDRC criterion and Q = 0 against unrounded Eq. 15 for H/d in (0, 18.06], the ends of the
    /// branches and their neighbours among them; worst relative difference.
    NdrcCriterion {
        /// How many H/d, log-uniform from the seed.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        points: usize,
    } in Exact, "relative", by ndrc_criterion, compares (Method Search | Formulas);
}

/// Which coefficients of Eq. 15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Eq15Form {
    /// As printed in the paper.
    Printed,
    /// Before rounding.
    Unrounded,
}

impl Eq15Form {
    fn formula(self) -> fn(f64) -> f64 {
        match self {
            Self::Printed => eq15_printed,
            Self::Unrounded => eq15_unrounded,
        }
    }
}

/// Diameter, mass, strength and S of the formulas' scenes: any will do, the groups alone matter.
const MASS: f64 = 2.0;

/// A scene of given N (`None`: Q = 0).
fn scene(geometry: Option<f64>) -> (Scene, Concrete) {
    let mut concrete = concrete(0.05, 1.0, 0.0);
    if let Some(n) = geometry {
        concrete.density = groups::density_for(n, MASS, &concrete);
    }
    (Scene::of_concrete(MASS, concrete.clone()), concrete)
}

/// X/d by the claim's method at impact function `impact`.
pub(super) fn solved_depth_ratio(subject: &Subject<'_>, geometry: Option<f64>, impact: f64) -> Found<f64> {
    let (scene, concrete) = scene(geometry);
    let method = subject.method(None)?;
    let speed = groups::impact_speed_for(impact, MASS, &concrete);
    let problem = scene.resolve(speed)?;
    let flight = solve(&method, &problem, Detail::End)?;
    Ok(flight.end.depth / concrete.diameter)
}

/// N* against `8 ∫ y sin²(angle) dy` over the radius, and the height against the circle of the nose.
///
/// In the radius y the integrand is a cubic for every shape, which Simpson's rule integrates exactly; `sin²` of the angle
/// between axis and tangent comes from the normal of the circle.
fn nose(_: &Subject<'_>) -> Found {
    // A flat of t d in front, and the face behind it.
    let truncated = |t: f64, sine_squared: &dyn Fn(f64) -> f64| {
        let f = |y: f64| 8.0 * y * sine_squared(y);
        let from = 0.5 * t;
        t * t + (f(from) + 4.0 * f(0.5 * (from + 0.5)) + f(0.5)) * (0.5 - from) / 6.0
    };
    let integral = |sine_squared: &dyn Fn(f64) -> f64| truncated(0.0, sine_squared);
    let mut worst = Worst::default();
    let mut take = |shape: NoseShape, found: f64, exact: f64| {
        worst.take(off(found, exact), || format!("for {shape:?}"));
    };
    for psi in [0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.25, 6.0] {
        let ogive = NoseShape::Ogive { caliber_radius_head: psi };
        take(ogive, ogive.factor(), integral(&|y| 1.0 - ((y + psi - 0.5) / psi).powi(2)));
        let cone = NoseShape::Cone { length_ratio: psi };
        take(cone, cone.factor(), integral(&|_| 0.25 / (0.25 + psi * psi)));
        let cap = NoseShape::Spherical { radius_ratio: psi };
        take(cap, cap.factor(), integral(&|y| 1.0 - (y / psi).powi(2)));
        for t in [0.15, 0.5, 0.8] {
            let ogive = NoseShape::TruncatedOgive { caliber_radius_head: psi, tip_ratio: t };
            take(ogive, ogive.factor(), truncated(t, &|y| 1.0 - ((y + psi - 0.5) / psi).powi(2)));
            take(ogive, (ogive.height_ratio().powi(2) + (0.5 * t + psi - 0.5).powi(2)).sqrt(), psi);
            let cone = NoseShape::TruncatedCone { length_ratio: psi, tip_ratio: t };
            let rise = 0.5 * (1.0 - t);
            take(cone, cone.factor(), truncated(t, &|_| rise * rise / (rise * rise + psi * psi)));
        }
        // Tip and shoulder lie on one circle: about the foot psi - 1/2 beyond the axis, or the centre of the sphere.
        let (h, foot) = (ogive.height_ratio(), psi - 0.5);
        take(ogive, (h * h + foot * foot).sqrt(), psi);
        let h = cap.height_ratio();
        take(cap, (0.25 + (psi - h) * (psi - h)).sqrt(), psi);
        holds!(h <= psi, "a cap of radius {psi} d cannot be {h} d high");
    }
    take(NoseShape::Flat, NoseShape::Flat.factor(), 1.0);
    Ok(worst.measurement())
}

fn small_impact(&SmallImpact { from, to, points }: &SmallImpact, subject: &Subject<'_>) -> Found {
    let mut random = subject.random(&subject.claim.id);
    let mut worst = Worst::default();
    for index in 0..points {
        let impact = match index {
            0 => from,
            1 => to,
            2 => std::f64::consts::FRAC_PI_2,
            _ => random.log_uniform(from, to),
        };
        let ours = solved_depth_ratio(subject, None, impact)?;
        worst.take(off(ours, depth_ratio(impact, 2.0)), || format!("at I = {impact:.4e}"));
    }
    Ok(worst.measurement())
}

/// Geometry functions of the approach: far enough for the first term to rule, not so far that it drowns.
const GEOMETRY: [f64; 2] = [1e4, 1e7];

/// Errors of Eq. 11-12 over 1/N at fixed I.
fn approach(subject: &Subject<'_>, impact: f64) -> Found<Vec<StepError>> {
    const POINTS: usize = 40;
    let mut random = Random::for_part(1, &subject.claim.id);
    let limit = depth_ratio(impact, 2.0);
    (0..POINTS)
        .map(|_| {
            let n = random.log_uniform(GEOMETRY[0], GEOMETRY[1]);
            let x = solved_depth_ratio(subject, Some(n), impact)?;
            Ok(StepError::new(1.0 / n, x - limit))
        })
        .collect()
}

fn approach_order(&ApproachOrder { impact }: &ApproachOrder, subject: &Subject<'_>) -> Found {
    let fit = fit(&approach(subject, impact)?)?;
    let line = fit.line.ok_or_else(|| NotMeasured::undecided(&fit.reason))?;
    Ok(Measurement::new((line.order - 1.0).abs())
        .resolving(half_width(&line))
        .remark(format!("order {:.5} in 1/N at I = {impact}", line.order))
        .evidence(Evidence::Fit { formal: 1.0, fit: Box::new(fit) }))
}

fn approach_constant(&ApproachConstant { impact }: &ApproachConstant, subject: &Subject<'_>) -> Found {
    // (X(N) - limit) N = C + C'/N: two geometry functions extrapolate C' away.
    let n = 1e5;
    let limit = depth_ratio(impact, 2.0);
    let at = |n: f64| -> Found<f64> { Ok((solved_depth_ratio(subject, Some(n), impact)? - limit) * n) };
    let measured = 2.0 * at(2.0 * n)? - at(n)?;
    // The stated first-order difference is relative to X/d, and per 1/N.
    let predicted = model_difference(impact, 1.0, 2.0) * limit;
    Ok(Measurement::new(off(measured, predicted))
        .remark(format!("(X/d - limit) N = {measured:.9}, predicted {predicted:.9}")))
}

/// E_c/(d³ fc S) of Eq. 11-12 (k = 2) with the ACE/NDRC relation, each branch with its coefficients spelled out.
///
/// Independent of the crate's own formula. The plain form loses digits by cancellation at small H/d.
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

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn eq15(&Eq15 { form, from, to }: &Eq15, _: &Subject<'_>) -> Found {
    const POINTS: usize = 2000;
    let mut worst = Worst::default();
    for index in 0..POINTS {
        let ratio = from * (to / from).powf(index as f64 / (POINTS - 1) as f64);
        worst.take(off(form.formula()(ratio), composed(ratio)), || format!("at H/d = {ratio:.4}"));
    }
    Ok(worst.measurement())
}

fn eq15_jump(&Eq15Jump { form, at, jump: stated }: &Eq15Jump, _: &Subject<'_>) -> Found {
    let formula = form.formula();
    // The branches are closed to the left (H/d <= 3.0), so one ulp to the right is the next branch.
    let jump = formula(at.next_up()) - formula(at);
    let listed = jumps().iter().any(|j| (j.thickness_ratio - at).abs() < 1e-9);
    holds!(listed || form != Eq15Form::Printed, "no joint at H/d = {at}");
    Ok(Measurement::new((jump - stated).abs()).remark(format!("jump {jump:+.9} S at H/d = {at}")))
}

fn ndrc_criterion(&NdrcCriterion { points }: &NdrcCriterion, subject: &Subject<'_>) -> Found {
    let (mut scene, concrete) = scene(None);
    scene.criterion = Criterion::Ndrc;
    let method = subject.method(None)?;
    let mut random = subject.random(&subject.claim.id);
    let joints = [2.994, NDRC_FIRST_BRANCH_END, 3.0, 3.8]
        .into_iter()
        .flat_map(|joint: f64| [joint.next_down(), joint, joint.next_up()])
        .chain([1e-3, NDRC_END]);
    let drawn = std::iter::repeat_with(|| random.log_uniform(1e-2, NDRC_END));
    let mut worst = Worst::default();
    for ratio in joints.chain(drawn).take(points) {
        scene.thickness = Some(ratio * concrete.diameter);
        let found = critical_velocity::of_scene(&scene, method.integrator())?;
        // From the thickness that the scene holds, which rounds H/d.
        let ratio = ratio * concrete.diameter / concrete.diameter;
        let ours = groups::dimensionless_energy(found.energy, &concrete) / concrete.static_factor;
        worst.take(off(ours, eq15_unrounded(ratio)), || format!("at H/d = {ratio:.4} of {points}"));
    }
    Ok(worst.measurement())
}
