//! How far may Eq. 11-12 be trusted, over the impact function I and the geometry function N?
//!
//! Eq. 11-12 is the limit N -> infinity of the equation of motion with a continuous crater constant, whose depth at
//! finite N is (Li & Chen 2003, Eq. 15)
//!
//! ```text
//! X/d = sqrt( (4 k I/pi) (N + k pi/4)/(N + I) )                      I <= k pi/4
//! X/d = k + (2 N/pi) log1p( (I - k pi/4)/(N + k pi/4) )              otherwise
//! ```
//!
//! The error of Eq. 11-12 is exact here, not the first term in 1/N ([`semi_empirical::model_difference`]), which is
//! 30 % off where the error is 20 %. It vanishes at I = k pi/4 for every N, is negative below (Eq. 11 is too shallow)
//! and positive above (too deep), and falls with N at fixed I; so each line of equal error is one N for each I.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use super::order::bisect;
use crate::physics::groups::Groups;
use crate::physics::semi_empirical;
use crate::physics::{CraterStiffness, Problem, Scene, Stage};
use crate::text::significant;

/// Error beyond which a scene counts as outside Eq. 11-12.
pub const ERROR_ALLOWED: f64 = 0.05;

/// Lines of the map: errors of 1, 5 and 20 %.
pub const LEVELS: [f64; 3] = [0.01, 0.05, 0.20];

/// Depth X/d of the equation of motion at impact function `impact`, finite `geometry` = N and `crater_ratio` = k.
///
/// Infinite I gives an infinite depth. Accurate to a few ulp: nothing cancels but I - k pi/4.
pub fn depth_ratio(impact: f64, geometry: f64, crater_ratio: f64) -> f64 {
    let (n, k) = (geometry, crater_ratio);
    let edge = k * FRAC_PI_4;
    if impact <= edge {
        (k * impact / FRAC_PI_4 * ((n + edge) / (n + impact))).sqrt()
    } else {
        k + n / FRAC_PI_2 * ((impact - edge) / (n + edge)).ln_1p()
    }
}

/// The impact function I at which [`depth_ratio`] is `depth_ratio`; without drag for `geometry` = `None`.
///
/// ```text
/// X/d <= k: I = (X/d)² N/((4 k/pi)(N + k pi/4) - (X/d)²)      beyond: I = k pi/4 + (N + k pi/4) expm1(pi (X/d - k)/(2 N))
/// ```
pub fn impact_at(depth_ratio: f64, geometry: Option<f64>, crater_ratio: f64) -> f64 {
    let (y, k) = (depth_ratio, crater_ratio);
    let Some(n) = geometry else { return semi_empirical::impact_function(y, k) };
    let edge = k * FRAC_PI_4;
    if y <= k {
        y * y * n / (k / FRAC_PI_4 * (n + edge) - y * y)
    } else {
        edge + (n + edge) * ((y - k) * FRAC_PI_2 / n).exp_m1()
    }
}

/// Error of Eq. 11-12, relative to the depth of the equation of motion; zero without drag (`geometry` = `None`).
pub fn model_error(impact: f64, geometry: Option<f64>, crater_ratio: f64) -> f64 {
    let (Some(n), k) = (geometry, crater_ratio) else { return 0.0 };
    let edge = k * FRAC_PI_4;
    if impact <= edge {
        // Eq. 11 over the depth is sqrt(1 - (k pi/4 - I)/(N + k pi/4)): no difference of near equals.
        (0.5 * (-(edge - impact) / (n + edge)).ln_1p()).exp_m1()
    } else {
        semi_empirical::depth_ratio(impact, k) / depth_ratio(impact, n, k) - 1.0
    }
}

/// The N at which the error of Eq. 11-12 is `level` in size; `None` where it is less at every N.
///
/// Above that N it is smaller. Bisection in ln N over 1e-9 to 1e12, to 1e-12 relative.
pub fn geometry_at(level: f64, impact: f64, crater_ratio: f64) -> Option<f64> {
    let beyond = |ln_n: f64| model_error(impact, Some(ln_n.exp()), crater_ratio).abs() > level;
    let (low, high) = (1e-9_f64.ln(), 1e12_f64.ln());
    (beyond(low) && !beyond(high)).then(|| bisect(low, high, 60, beyond).exp())
}

/// A stretch of a line of equal error: (I, N), ascending in I.
pub type Stretch = Vec<(f64, f64)>;

/// The line of error `level` in `impacts` (ascending), in as many stretches as it has.
pub fn contour(level: f64, impacts: &[f64], crater_ratio: f64) -> Vec<Stretch> {
    let point = |&impact: &f64| Some((impact, geometry_at(level, impact, crater_ratio)?));
    let points: Vec<_> = impacts.iter().map(point).collect();
    let stretches = points.split(Option::is_none).filter(|stretch| stretch.len() > 1);
    stretches.map(|stretch| stretch.iter().copied().flatten().collect()).collect()
}

/// A stretch of a line of equal error, with its error.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Line {
    /// Size of the relative error.
    pub level: f64,
    /// (I, N), ascending in I.
    pub points: Stretch,
}

/// The map for one k: the lines of every level of [`LEVELS`] over I from 0.01 to 1000, 120 points a decade, and more
/// about I = k pi/4, where the lines are steep.
pub fn lines(crater_ratio: f64) -> Vec<Line> {
    let edge = crater_ratio * FRAC_PI_4;
    let near = (4..=20).flat_map(|i| [-1.0, 1.0].map(|side| edge * (1.0 + side * 10f64.powf(f64::from(i) / -10.0))));
    let mut impacts: Vec<f64> = (0..=600).map(|i| 10f64.powf(-2.0 + f64::from(i) / 120.0)).chain(near).collect();
    impacts.sort_by(f64::total_cmp);
    let of = |level| contour(level, &impacts, crater_ratio).into_iter().map(move |points| Line { level, points });
    LEVELS.into_iter().flat_map(of).collect()
}

/// What a user should know of `scene` at `impact_speed` (m/s), one sentence each: Eq. 11-12 and 15 outside their
/// range, S outside the range of its fit. Empty for scenes of stages and layers, which have no Eq. 11-12.
pub fn warnings(scene: &Scene, impact_speed: f64) -> Vec<String> {
    let Some(concrete) = scene.concrete().filter(|concrete| concrete.layers.is_empty()) else { return Vec::new() };
    let mut warnings = Vec::new();
    if let Some(groups) = Groups::of(scene, impact_speed)
        && concrete.crater_stiffness == CraterStiffness::Continuous
    {
        let error = model_error(groups.impact, groups.geometry, concrete.crater_ratio);
        if error.is_nan() || error.abs() > ERROR_ALLOWED {
            let geometry = groups.geometry.unwrap_or(f64::INFINITY);
            let off = match 100.0 * error {
                percent if percent.abs() < 1e6 => format!("is {percent:+.1} % off the equation of motion"),
                percent if percent.is_finite() => format!("is {percent:+.1e} % off the equation of motion"),
                _ => "leaves the range of 64-bit numbers".to_owned(),
            };
            warnings.push(format!(
                "the scene lies outside Eq. 11-12 and 15, the limit N >> I and N >> 1: at I = {}, N = {} the depth \
                 of Eq. 11-12 {off}",
                rounded(groups.impact),
                rounded(geometry),
            ));
        }
    }
    if concrete.follows_eq14 {
        warnings.extend(concrete.use_of_eq14(impact_speed).departures());
    }
    warnings
}

/// What a user should know of drag where a projectile stops or leaves within the crater, at the impact speed of `problem`.
///
/// There `c/c(Q = 0) = (1 + Q V0²/P)/(1 + k d Q/M)` is less than one: drag that is stronger makes a crater that is softer.
pub fn drag_in_crater(scene: &Scene, problem: &Problem) -> Option<String> {
    let crater = problem
        .crater
        .filter(|_| scene.concrete().is_some_and(|c| c.crater_stiffness == CraterStiffness::Continuous))?;
    let (kd, Stage { static_force, .. }) = (problem.stages[crater].end, problem.stages[crater + 1]);
    let lowered = 1.0 - problem.stages[crater].stiffness * kd / static_force;
    (lowered > 1e-12).then(|| {
        format!(
            "this projectile stops or leaves within x = k d, where drag acts through the crater constant c alone, which \
             it lowers, here by {} %: in this model more density, nose factor or B then means less resistance",
            significant(100.0 * lowered)
        )
    })
}

/// A group for people: four decimals, scientific where those would be hundreds of digits or none.
fn rounded(group: f64) -> String {
    if group.is_infinite() {
        "infinity".to_owned()
    } else if group == 0.0 || (1e-3..1e7).contains(&group) {
        format!("{group:.4}")
    } else {
        format!("{group:.4e}")
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::{ClosedForm, Detail, Integrator, Taylor};
    use crate::physics::Parameter;

    fn slab() -> Scene {
        crate::testing::shipped("paper-slab")
    }

    /// (I, N, k -> X/d) of `docs/theory.md`, section 2.
    #[test]
    fn depth_is_that_of_li_and_chen_at_finite_n() {
        for (impact, geometry, k, expected) in [
            (0.5, 10.0, 2.0, 1.184_519_008_163_294_5),
            (2.0, 10.0, 2.0, 2.231_871_462_056_812_7),
            (100.0, 10.0, 2.0, 16.336_651_809_520_088),
            (0.2, 20.0, 0.707, 0.428_021_653_964_986_7),
            (50.0, 234.3, 2.365, 30.038_836_818_523_704),
            // Forrestal 1994 shot 14 with the published groups: 6.21.
            (8.455, 125.9, 2.0, 6.215_773_173_665_595),
        ] {
            assert!((depth_ratio(impact, geometry, k) / expected - 1.0).abs() < 4e-16, "{impact} {geometry}");
        }
    }

    #[test]
    fn the_impact_function_of_a_depth_is_the_one_that_gives_it() {
        for (impact, geometry, k) in [(0.5, 10.0, 2.0), (2.0, 10.0, 2.0), (100.0, 10.0, 2.0), (0.2, 20.0, 0.707)] {
            let y = depth_ratio(impact, geometry, k);
            assert!((impact_at(y, Some(geometry), k) / impact - 1.0).abs() < 4e-15, "{impact}");
            let y = semi_empirical::depth_ratio(impact, k);
            assert!((impact_at(y, None, k) / impact - 1.0).abs() < 4e-15, "{impact}");
        }
    }

    #[test]
    fn error_is_that_of_eq_11_12_against_flights() {
        for (impact, geometry) in [(0.3, 3.0), (1.2, 40.0), (5.0, 3.0), (60.0, 200.0)] {
            let mut scene = slab();
            scene.thickness = None;
            Parameter::Geometry.set(&mut scene, geometry).unwrap();
            Parameter::Impact.set(&mut scene, impact).unwrap();
            let problem = scene.problem().unwrap();
            for method in [&Taylor::default() as &dyn Integrator, &ClosedForm] {
                let ratio = method.solve(&problem, Detail::End).unwrap().end.depth / 0.06;
                let error = semi_empirical::depth_ratio(impact, 2.0) / ratio - 1.0;
                assert!((error - model_error(impact, Some(geometry), 2.0)).abs() < 1e-14, "{impact} {geometry}");
            }
        }
    }

    #[test]
    fn error_tends_to_its_first_term_as_n_grows_and_falls_with_n_everywhere() {
        for impact in [0.01, 0.5, 1.5, 2.0, 30.0, 1000.0] {
            let mut previous = f64::INFINITY;
            for exponent in -12..40 {
                let n = 10f64.powf(f64::from(exponent) / 4.0);
                let error = model_error(impact, Some(n), 2.0).abs();
                assert!(error < previous * (1.0 + 1e-12) + 1e-14, "I {impact} N {n}: {error} after {previous}");
                previous = error;
            }
            let n = 1e7 * (1.0 + impact);
            let ratio = -model_error(impact, Some(n), 2.0) / semi_empirical::model_difference(impact, n, 2.0);
            assert!((ratio - 1.0).abs() < 1e-5, "{impact}: {ratio}");
        }
    }

    #[test]
    fn a_line_of_equal_error_has_that_error_and_is_missing_only_where_no_n_has_it() {
        for level in LEVELS {
            for impact in [0.01, 1.0, 1.5, 1.6, 3.0, 100.0] {
                match geometry_at(level, impact, 2.0) {
                    Some(n) => assert!((model_error(impact, Some(n), 2.0).abs() / level - 1.0).abs() < 1e-9),
                    None => assert!(model_error(impact, Some(1e-9), 2.0).abs() <= level, "{level} {impact}"),
                }
            }
        }
        let impacts: Vec<f64> = (0..200).map(|i| 10f64.powf(-2.0 + f64::from(i) / 40.0)).collect();
        // The line is broken at I = k pi/4, where Eq. 11-12 is exact.
        assert_eq!(contour(0.01, &impacts, 2.0).len(), 2);
    }

    /// At H/d = 1 the drag of the slab takes 3.0 % of E_c, and so of c.
    #[test]
    fn drag_that_softens_the_crater_is_said_with_its_share() {
        let mut scene = slab();
        let said = |scene: &Scene, speed: f64| drag_in_crater(scene, &scene.resolve(speed).unwrap());
        Parameter::ThicknessRatio.set(&mut scene, 1.0).unwrap();
        let critical = crate::studies::critical_velocity::exact(&scene).unwrap();
        let text = said(&scene, critical).unwrap();
        assert!(text.contains("here by 2.96") && text.contains("less resistance"), "{text}");
        assert_eq!(said(&scene, 500.0), None);
        Parameter::Density.set(&mut scene, 0.0).unwrap();
        assert_eq!(said(&scene, critical), None);
    }

    #[test]
    fn a_scene_outside_is_warned_of_and_one_inside_is_not() {
        let mut scene = slab();
        Parameter::Geometry.set(&mut scene, 1e4).unwrap();
        assert_eq!(warnings(&scene, 200.0), Vec::<String>::new());
        Parameter::Geometry.set(&mut scene, 5.0).unwrap();
        let said = warnings(&scene, 200.0);
        assert!(said.len() == 1 && said[0].contains("Eq. 11-12"), "{said:?}");
        Parameter::Density.set(&mut scene, 0.0).unwrap();
        Parameter::Strength.set(&mut scene, 150e6).unwrap();
        let said = warnings(&scene, 200.0);
        assert!(said.len() == 1 && said[0].contains("150 MPa"), "{said:?}");
    }
}
