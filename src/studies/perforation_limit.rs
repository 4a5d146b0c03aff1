//! The perforation limit e: the thickness that just stops a projectile of a given impact speed (Eq. 1 of the paper).
//!
//! A target of thickness H is perforated where the depth X in an unlimited target reaches the exit depth of H. So with the
//! criterion x = H the limit is the depth itself, and with the ACE/NDRC relation the thickness that belongs to it:
//!
//! ```text
//! full-depth: e = X            ndrc: e/d = 3.19 y - 0.718 y²   y = X/d <= 1.35;   1.32 + 1.24 y   beyond
//! ```
//!
//! X comes from the equation of motion, or for comparison from Eq. 11-12. With the criterion `plug` the path V(x) does not depend on
//! the thickness until the rest breaks off, so e is the thickest slab that it breaks anywhere:
//!
//! ```text
//! plug: e = max over x of x + r(F(x, V(x))),   r the thickness whose strength R(r) is F      (`physics::plug`)
//! ```

use thiserror::Error;

use super::order::try_bisect;
use crate::integrators::{Detail, IntegrationError, Integrator};
use crate::physics::groups::Groups;
use crate::physics::semi_empirical::{self, perforated_thickness_ratio};
use crate::physics::{
    Advice, Criterion, Force, Layer, Outcome, Problem, Resistance, ResolveError, Resolved, Scene, Shown, Stage,
};

/// A perforation limit and how it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerforationLimit {
    /// e (m).
    pub thickness: f64,
    /// Half-width of its error bound (m): that of the exit energy at H = e over its slope. `None` where the method states
    /// none.
    pub error: Option<f64>,
    /// Depth X (m) of the same shot in an unlimited target.
    pub depth: f64,
}

/// Why there is no perforation limit.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LimitError {
    /// The scene has no equation of motion.
    #[error(transparent)]
    Scene(#[from] ResolveError),
    /// No thickness stops the projectile, or the method fails.
    #[error("no perforation limit: {0}")]
    Flight(#[from] IntegrationError),
    /// The flight ended without a stop: a table of a force that ends.
    #[error("no depth of rest in an unlimited target: the flight ends at x = {} m, {outcome}", Shown(*.depth))]
    NoRest {
        /// Where it ended (m).
        depth: f64,
        /// How it ended.
        outcome: Outcome,
    },
}

impl Advice for LimitError {
    fn inner(&self) -> Option<&dyn Advice> {
        match self {
            Self::Scene(error) => Some(error),
            Self::Flight(error) => Some(error),
            Self::NoRest { .. } => None,
        }
    }

    fn is_usage(&self) -> bool {
        self.inner().is_some_and(Advice::is_usage)
    }

    fn help(&self) -> String {
        self.inner().map_or_else(|| "continue the force to where the projectile rests".to_owned(), Advice::help)
    }
}

/// `scene` without a far side, whose criterion is then x = H unless it is `ndrc`: its last layer or stage goes on for ever.
pub fn unlimited(scene: &Scene) -> Scene {
    let mut scene = Scene { thickness: None, plug: None, ..scene.clone() };
    if scene.criterion == Criterion::Plug {
        scene.criterion = Criterion::FullDepth;
    }
    match &mut scene.resistance {
        Resistance::Concrete(concrete) => {
            if let Some(Layer { thickness, .. }) = concrete.layers.last_mut() {
                *thickness = f64::INFINITY;
            }
        }
        Resistance::Stages(stages) => {
            let last = stages.len().saturating_sub(1);
            // A table ends where its rows do.
            let is_table = scene.forces.iter().any(|(stage, force)| *stage == last && matches!(force, Force::Table(_)));
            if let Some(stage) = stages.last_mut().filter(|_| !is_table) {
                stage.end = f64::INFINITY;
            }
        }
    }
    scene
}

/// Perforation limit of `scene` at its impact speed through `integrator`, by the criterion of the scene.
///
/// Two flights: one without a far side for X, and one against a target of that exit depth for the error bound
/// `|dX| = dW M/(2 F(X, 0))`, where dW is that of the exit energy W.
///
/// # Errors
/// [`LimitError`].
pub fn of_scene(scene: &Scene, integrator: &dyn Integrator) -> Result<PerforationLimit, LimitError> {
    let problem = unlimited(scene).problem()?;
    let flight = integrator.solve(&problem, Detail::End)?;
    let depth = flight.end.depth;
    if !flight.outcome.is_stop() {
        return Err(LimitError::NoRest { depth, outcome: flight.outcome });
    }
    let (thickness, slope) = match scene.criterion {
        Criterion::FullDepth => (depth, 1.0),
        Criterion::Plug => return of_plug(scene, &problem, depth, integrator),
        Criterion::Ndrc => {
            let d = scene.concrete().ok_or(ResolveError::NoDiameter)?.diameter;
            let y = depth / d;
            (d * perforated_thickness_ratio(y), semi_empirical::perforation_slope(y))
        }
    };
    let at_exit = integrator.solve(&problem.clone().with_exit(depth), Detail::End);
    let error = at_exit.ok().and_then(|at_exit| {
        let energy = at_exit.exit_margin_error? * problem.impact_speed * problem.impact_speed;
        let force = problem.force(flight.stage, depth, 0.0);
        let error = slope * 0.5 * energy * problem.mass / force;
        error.is_finite().then_some(error.max(f64::EPSILON * thickness))
    });
    Ok(PerforationLimit { thickness, error, depth })
}

/// The limit of a slab that plugs: bisection over the thickness between the depth X of `problem`, without a far side, and X with the
/// rest that withstands the largest force of the path.
///
/// The bound is half the width over which the outcome is undecided.
fn of_plug(
    scene: &Scene,
    problem: &Problem,
    depth: f64,
    integrator: &dyn Integrator,
) -> Result<PerforationLimit, LimitError> {
    /// The width of the bracket, a multiple of the limit, comes to its last bit.
    const HALVINGS: u32 = 80;
    /// Of the force at a corner of it, where no width is undecided: it is 22 at worst in the tests.
    const ROUNDINGS: f64 = 64.0;
    let (Some(plug), Some(concrete)) = (scene.plug, scene.concrete()) else { return Err(ResolveError::NoPlug.into()) };
    let at_speed = |stage: &Stage| {
        let end = if stage.end.is_finite() { stage.end } else { 0.0 };
        stage.force(end, problem.impact_speed).max(stage.force(0.0, problem.impact_speed))
    };
    let force = problem.stages.iter().map(at_speed).fold(0.0, f64::max);
    let beyond = 2.0 * (depth + plug.static_thickness(force, concrete.diameter));
    let of_thickness = |thickness| -> Result<_, LimitError> {
        let slab = Scene { thickness: Some(thickness), ..scene.clone() };
        Ok(integrator.solve(&slab.problem()?, Detail::End)?)
    };
    let low =
        try_bisect(0.0, beyond, HALVINGS, |h| Ok::<_, LimitError>(of_thickness(h)?.outcome == Outcome::Perforated))?;
    let high = try_bisect(beyond, low, HALVINGS, |h| Ok::<_, LimitError>(of_thickness(h)?.outcome.is_stop()))?;
    let thickness = 0.5 * (low + high);
    let has_bound = of_thickness(beyond)?.exit_margin_error.is_some();
    let error = has_bound.then(|| (0.5 * (high - low)).max(ROUNDINGS * f64::EPSILON * thickness));
    Ok(PerforationLimit { thickness, error, depth })
}

/// Perforation limit e/d of Eq. 11-12 for `scene` at its impact speed, by x = H and by the ACE/NDRC relation; `None`
/// for stages and layers.
///
/// # Errors
/// [`ResolveError`]: no impact speed.
pub fn of_eq11_12(scene: &Scene) -> Resolved<Option<[f64; 2]>> {
    let speed = scene.velocity.ok_or(ResolveError::NoImpactSpeed)?;
    Ok(Groups::of(scene, speed).map(|Groups { depth_ratio_eq11_12: y, .. }| [y, perforated_thickness_ratio(y)]))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::integrators::{CentralDifference, ClosedForm, Energy, Taylor};
    use crate::physics::Plug;
    use crate::testing::shipped;

    /// e of a shipped scene at `speed` by both criteria, by the equation of motion and by Eq. 11-12.
    fn limits(name: &str, speed: f64, integrator: &dyn Integrator) -> [f64; 4] {
        let scene = Scene { velocity: Some(speed), ..shipped(name) };
        let by = |criterion| of_scene(&Scene { criterion, ..scene.clone() }, integrator).unwrap().thickness;
        let d = scene.concrete().unwrap().diameter;
        let [y, e] = of_eq11_12(&scene).unwrap().unwrap();
        [by(Criterion::FullDepth), by(Criterion::Ndrc), y * d, e * d]
    }

    /// mpmath, 40 digits, of the decimal texts: I = M V²/(S fc d³), N = M/(N* B rho d³); X/d of Li & Chen, Eq. 15a and b,
    /// then `h = 3.19 y - 0.718 y²` or `1.32 + 1.24 y`; the same with X/d of Eq. 11-12; times d.
    #[test]
    fn limits_are_those_of_the_formulas_in_40_digits() {
        for (name, speed, expected) in [
            (
                "paper-slab",
                200.0,
                [0.356_909_028_525_065_8, 0.521_767_195_371_081_5, 0.387_479_306_773_447_19, 0.559_674_340_399_074_5],
            ),
            (
                "paper-slab",
                50.0,
                [0.071_008_165_777_319_01, 0.166_178_205_531_839, 0.070_087_014_500_56, 0.164_795_040_690_952_63],
            ),
            (
                "perforate",
                400.0,
                [0.200_771_367_406_780_5, 0.314_956_495_584_407_8, 0.238_628_080_701_505_58, 0.361_898_820_069_866_9],
            ),
            (
                "forrestal-1994-shot-14",
                277.0,
                [0.167_195_080_269_960_7, 0.242_829_899_534_751_2, 0.171_690_273_758_654_8, 0.248_403_939_460_731_96],
            ),
        ] {
            for method in [&Taylor::default() as &dyn Integrator, &Energy::default(), &ClosedForm] {
                for (found, expected) in limits(name, speed, method).into_iter().zip(expected) {
                    assert_relative_eq!(found, expected, max_relative = 2e-15);
                }
            }
        }
    }

    /// Half angle (degrees), shear strength (Pa), impact speed (m/s), e (m).
    const PLUGS: [(f64, f64, f64, f64); 5] = [
        (60.0, 10e6, 100.0, 0.274_367_642_743_509_5),
        (60.0, 10e6, 200.0, 0.490_410_861_188_713_9),
        (0.0, 20e6, 60.0, 0.309_764_734_821_406_3),
        (0.0, 1e6, 400.0, 11.881_144_521_080_945),
        (45.0, 2e5, 700.0, 3.362_643_974_047_681),
    ];

    /// The paper's slab, mpmath, 40 digits: P, Q and the continuous c of the decimal texts, V² by
    /// energy over x in crater and tunnel, `r = 2 A/(d + sqrt(d² + 4 A tan a))` with A = F/(pi tau), e the largest x + r over 2000
    /// places: at rest, or at k d (the fourth).
    #[test]
    fn the_limit_of_a_plug_is_the_thickest_slab_that_the_path_breaks_anywhere() {
        for (half_angle, shear_strength, speed, expected) in PLUGS {
            let plug = Some(Plug { half_angle, shear_strength });
            let slab = shipped("paper-slab");
            let scene = Scene { velocity: Some(speed), criterion: Criterion::Plug, plug, ..slab };
            let found = of_scene(&scene, &Taylor::default()).unwrap();
            let error = found.error.unwrap();
            assert!((found.thickness - expected).abs() <= error.max(1e-15) && error < 1e-9, "{found:?} {expected}");
        }
    }

    /// The bound is that of a method that is off on purpose: it holds the exact limit.
    #[test]
    fn the_error_bound_holds_the_limit_and_a_scheme_without_bound_states_none() {
        let scene = shipped("perforate");
        let exact = of_scene(&scene, &ClosedForm).unwrap().thickness;
        for rtol in [1e-4, 1e-8] {
            let rough = of_scene(&scene, &Taylor::with_rtol(rtol).unwrap()).unwrap();
            let bound = rough.error.unwrap();
            assert!((rough.thickness - exact).abs() <= bound && bound < 0.1 * exact, "{rough:?} {exact}");
        }
        assert_eq!(of_scene(&scene, &CentralDifference::default()).unwrap().error, None);
    }

    #[test]
    fn what_never_rests_and_what_has_no_speed_has_no_limit() {
        assert!(matches!(of_scene(&shipped("stiff"), &Taylor::default()), Err(LimitError::Flight(_))));
        let still = Scene { velocity: None, ..shipped("paper-slab") };
        assert_eq!(of_scene(&still, &ClosedForm), Err(LimitError::Scene(ResolveError::NoImpactSpeed)));
        assert!(of_eq11_12(&still).is_err());
    }
}
