//! Which dimensionless groups a scene has, and which numbers give a scene a wanted group.
//!
//! ```text
//! I = M V0²/(S fc d³),   N = M/(N* B rho d³),   H/d,   X/d,   E_c/(d³ fc),   rho V0²/fc
//! ```
//!
//! Source: Li & Chen (2003), Eq. 5-7, 13, 14. Eq. 13 of the paper prints N without N*, its nose being flat (N* = 1).

use super::scene::{Concrete, Resistance, Scene};
use super::semi_empirical;

/// The groups of a scene of one concrete.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Groups {
    /// Impact function I.
    pub impact: f64,
    /// Geometry function N; `None` without drag (Q = 0), where it is infinite.
    pub geometry: Option<f64>,
    /// M/(rho d³), which Eq. 13 prints as N: without N* and B; `None` for a density of 0.
    pub mass_ratio: Option<f64>,
    /// Relative target thickness H/d; `None` for a semi-infinite target.
    pub thickness_ratio: Option<f64>,
    /// Johnson number rho V0²/fc.
    pub johnson: f64,
    /// Depth X/d of Eq. 11-12, the limit of N -> infinity.
    pub depth_ratio_eq11_12: f64,
}

impl Groups {
    /// The groups of `scene` at `impact_speed` (m/s).
    ///
    /// `None` for a scene of stages, which has no diameter, and of layers, which has no one strength.
    pub fn of(scene: &Scene, impact_speed: f64) -> Option<Self> {
        let Resistance::Concrete(concrete) = &scene.resistance else { return None };
        if !concrete.layers.is_empty() {
            return None;
        }
        let d = concrete.diameter;
        let speed_per_diameter = impact_speed / d;
        let scaled_density = concrete.nose_factor * concrete.inertia_factor * concrete.density;
        // Squares of speed and cubes of length are shared out, so that neither overflows before the quotient.
        let impact =
            (scene.mass / d) * speed_per_diameter / (concrete.static_factor * concrete.strength) * speed_per_diameter;
        let mass_over = |density: f64| (density > 0.0).then(|| (scene.mass / d) / (density * d * d));
        Some(Self {
            impact,
            geometry: mass_over(scaled_density),
            mass_ratio: mass_over(concrete.density),
            thickness_ratio: scene.thickness.map(|thickness| thickness / d),
            johnson: (concrete.density * impact_speed) * (impact_speed / concrete.strength),
            depth_ratio_eq11_12: semi_empirical::depth_ratio(impact, concrete.crater_ratio),
        })
    }
}

/// Impact speed (m/s) at which a projectile of `mass` (kg) has the impact function `impact`: `d sqrt(I S fc d/M)`.
pub fn impact_speed_for(impact: f64, mass: f64, concrete: &Concrete) -> f64 {
    let d = concrete.diameter;
    d * (impact * (concrete.static_factor * concrete.strength) * (d / mass)).sqrt()
}

/// Target density (kg/m³) at which a projectile of `mass` (kg) has the geometry function `geometry`:
/// `M/(N N* B d³)`. Not finite without a nose factor or an inertia factor.
pub fn density_for(geometry: f64, mass: f64, concrete: &Concrete) -> f64 {
    let d = concrete.diameter;
    (mass / d) / (geometry * concrete.nose_factor * concrete.inertia_factor * d * d)
}

/// `E/(d³ fc)` of an energy (J): the ordinate of the paper's Figure 4.
pub fn dimensionless_energy(energy: f64, concrete: &Concrete) -> f64 {
    let d = concrete.diameter;
    energy / d / (concrete.strength * d * d)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::physics::Layer;
    use crate::testing::{concrete, scene};

    #[test]
    fn groups_of_shot_14_are_those_published() {
        // Li & Chen (2003), table 2: I = 8.455, N = 125.9, both rounded.
        let scene = scene();
        let groups = Groups::of(&scene, 277.0).unwrap();
        assert_relative_eq!(groups.impact, 8.455, epsilon = 5e-4);
        assert_relative_eq!(groups.geometry.unwrap(), 125.7, epsilon = 0.3);
        assert_eq!(groups.thickness_ratio, None);
        // N without N* = 0.15625, the ogive's; k/2 + 2 I/pi.
        assert_relative_eq!(groups.mass_ratio.unwrap(), 0.156_25 * groups.geometry.unwrap(), max_relative = 1e-15);
        assert_relative_eq!(
            groups.depth_ratio_eq11_12,
            1.0 + 2.0 * groups.impact / std::f64::consts::PI,
            max_relative = 1e-15
        );
    }

    #[test]
    fn johnson_number_is_impact_function_times_static_factor_over_mass_ratio() {
        let scene = Scene { thickness: Some(0.0538), ..scene() };
        let groups = Groups::of(&scene, 277.0).unwrap();
        let concrete = concrete();
        let mass_ratio = scene.mass / (concrete.density * concrete.diameter.powi(3));
        assert_relative_eq!(groups.johnson, groups.impact * concrete.static_factor / mass_ratio, max_relative = 1e-15);
        assert_relative_eq!(groups.thickness_ratio.unwrap(), 2.0, max_relative = 1e-15);
    }

    #[test]
    fn geometry_function_is_the_mass_over_that_of_nose_inertia_and_concrete() {
        // 2/(0.5 · 1.25 · 3200 · 0.1³)
        let concrete =
            Concrete { diameter: 0.1, nose_factor: 0.5, inertia_factor: 1.25, density: 3200.0, ..concrete() };
        assert_relative_eq!(density_for(1.0, 2.0, &concrete), 3200.0, max_relative = 1e-15);
        let groups = Groups::of(&Scene::of_concrete(2.0, concrete), 1.0).unwrap();
        assert_relative_eq!(groups.geometry.unwrap(), 1.0, max_relative = 1e-15);
    }

    #[test]
    fn a_wanted_group_is_the_group_one_gets() {
        let mut wanted = scene();
        let given = Concrete { inertia_factor: 1.3, ..concrete() };
        let speed = impact_speed_for(3.5, wanted.mass, &given);
        let density = density_for(17.0, wanted.mass, &given);
        wanted.resistance = Resistance::Concrete(Concrete { density, ..given });
        let groups = Groups::of(&wanted, speed).unwrap();
        assert_relative_eq!(groups.impact, 3.5, max_relative = 1e-15);
        assert_relative_eq!(groups.geometry.unwrap(), 17.0, max_relative = 1e-15);
    }

    #[test]
    fn stages_and_layers_have_no_groups_and_no_drag_no_geometry_function() {
        let bare = Resistance::Concrete(Concrete { density: 0.0, ..concrete() });
        assert_eq!(Groups::of(&Scene { resistance: bare, ..scene() }, 1.0).unwrap().geometry, None);
        let stages = Scene { resistance: Resistance::Stages(Vec::new()), ..scene() };
        assert_eq!(Groups::of(&stages, 1.0), None);
        let layer = Layer {
            thickness: 1.0,
            strength: 30e6,
            density: 2300.0,
            static_factor: 12.0,
            follows_eq14: false,
            viscosity: 0.0,
        };
        let layered = Resistance::Concrete(Concrete { layers: vec![layer], ..concrete() });
        assert_eq!(Groups::of(&Scene { resistance: layered, ..scene() }, 1.0), None);
    }

    #[test]
    fn critical_energy_over_strength_is_half_the_impact_function_times_static_factor() {
        let scene = scene();
        let impact = Groups::of(&scene, 277.0).unwrap().impact;
        let energy = 0.5 * scene.mass * 277.0 * 277.0;
        assert_relative_eq!(dimensionless_energy(energy, &concrete()), 12.0 * impact / 2.0, max_relative = 1e-15);
    }
}
