//! Shear plugging: when the rest of a slab gives way as one plug, and what moves then.
//!
//! ```text
//! r = H - x                                         what is left of the slab
//! R = tau pi r (d + r tan a)                        its strength: tau over the frustum of half angle a, along the axis
//! m = rho pi r (d²/4 + d r tan a/2 + r² tan² a/3)   the mass of the frustum
//! F(x, V) = R(x)                                    the plug breaks off
//! V -> V M/(M + m)                                  momentum is kept, and nothing resists the frustum, which widens to the rear
//! ```
//!
//! Until then the forces of crater and tunnel act. At rest the force is P, and `P = R(H - H*)` gives the static thickness H*
//! of the plug, the least that any flight through a tunnel leaves:
//!
//! ```text
//! H*/d = (sqrt(1 + S fc tan a/tau) - 1)/(2 tan a)
//! ```
//!
//! Sources: Q. M. Li, D. J. Tong (2003), J. Eng. Mech. 129(9), 1083-1091; X. W. Chen, S. C. Fan, Q. M. Li (2004), Int. J.
//! Impact Engng 30(6), 617-637: crater, tunnel and plug in turn. The geometry is exact; that nothing resists the plug once it has
//! broken off, and momentum alone sets its velocity, is an assumption here, not confirmed in their text. Sources differ on a and tau.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::condition::Condition;
use super::expression::{Known, Tape, Unit};
use super::law::Law;
use super::problem::Stage;
use super::scalar::Scalar;
use super::units::Dimension;

/// What the rest of a slab withstands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plug {
    /// Half angle a of the frustum, from the axis (degrees).
    pub half_angle: f64,
    /// Shear strength tau (Pa).
    pub shear_strength: f64,
}

impl Plug {
    /// Static thickness H* (m) of the plug in front of a projectile of diameter `d` (m) with static resistance `p` (N).
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::Plug;
    /// // A cylinder: tau pi d H* = P.
    /// let plug = Plug { half_angle: 0.0, shear_strength: 10e6 };
    /// let d = 0.05;
    /// assert!((plug.static_thickness(10e6 * std::f64::consts::PI * d * 0.03, d) - 0.03).abs() < 1e-16);
    /// ```
    pub fn static_thickness(&self, p: f64, d: f64) -> f64 {
        let tangent = self.half_angle.to_radians().tan();
        // tan a r² + d r - P/(pi tau) = 0, in the form that does not cancel.
        let area = p / (PI * self.shear_strength);
        2.0 * area / (d + (d * d + 4.0 * tangent * area).sqrt())
    }

    /// Strength R (N) of what is left over the length `r` (m) in front of a projectile of diameter `d` (m).
    pub fn strength_left(&self, r: f64, d: f64) -> f64 {
        PI * self.shear_strength * r * (d + r * self.half_angle.to_radians().tan())
    }

    /// Mass (kg) of the frustum of length `r` (m) and density `rho` (kg/m³).
    pub fn mass(&self, r: f64, d: f64, rho: f64) -> f64 {
        let widening = r * self.half_angle.to_radians().tan();
        PI * rho * r * (0.25 * d * d + 0.5 * d * widening + widening * widening / 3.0)
    }
}

/// The numbers of a slab that plugs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab<S> {
    pub(super) thickness: S,
    pub(super) diameter: S,
    pub(super) density: S,
    pub(super) shear_strength: S,
    /// Of the half angle.
    pub(super) tangent: S,
}

/// The equation of strength and force, and the mass of the plug.
struct Texts {
    equation: Tape,
    mass: Tape,
}

/// Quantities of the equation: coefficients of the force, then [`Slab`].
const KNOWN: [(&str, Option<Dimension>); 9] = [
    ("p", Some(Dimension::Force)),
    ("s", Some(Dimension::Stiffness)),
    ("r", Some(Dimension::Viscosity)),
    ("q", Some(Dimension::Drag)),
    ("H", Some(Dimension::Length)),
    ("d", Some(Dimension::Length)),
    ("rho", Some(Dimension::Density)),
    ("tau", Some(Dimension::Pressure)),
    ("t", None),
];

fn texts() -> &'static Texts {
    static TEXTS: LazyLock<Option<Texts>> = LazyLock::new(|| {
        let known = KNOWN.map(|(name, dimension)| Known { name, value: 0.0, unit: Unit::from(dimension) });
        let equation = "pi*tau*(H - x)*(d + (H - x)*t) = p + s*x + r*V + q*V^2";
        let mass = "pi*rho*(H - x)*(d^2/4 + d*(H - x)*t/2 + ((H - x)*t)^2/3)";
        let equation = Tape::read_equation(equation, &known).ok()?;
        Some(Texts { equation, mass: Tape::read(mass, &known, Dimension::Mass.into()).ok()? })
    });
    match &*TEXTS {
        Some(texts) => texts,
        None => unreachable!("both texts are expressions"),
    }
}

impl<S: Scalar> Slab<S> {
    fn parameters(&self, stage: &Stage<S>) -> Vec<S> {
        let Stage { static_force, stiffness, viscosity, drag, .. } = *stage;
        let Self { thickness, diameter, density, shear_strength, tangent } = *self;
        vec![static_force, stiffness, viscosity, drag, thickness, diameter, density, shear_strength, tangent]
    }

    /// The law of `stage`, which ends where the plug breaks off, with stage `plug` behind that.
    pub(super) fn breaking(&self, stage: &Stage<S>, plug: usize) -> Law<S> {
        let parameters = self.parameters(stage);
        Law::of_coefficients(stage).ending(Condition::of_plug(&texts().equation, parameters, plug))
    }

    /// The law of projectile and plug: no force.
    pub(super) fn moving(&self) -> Law<S> {
        let free = Stage::free();
        Law::of_coefficients(&free).joined_by(&texts().mass, self.parameters(&free))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_static_plug_has_the_strength_of_the_static_force_and_the_texts_say_what_the_formulas_say() {
        let (d, rho, thickness) = (0.05, 2300.0, 0.2);
        for half_angle in [0.0, 30.0, 60.0, 89.0] {
            let plug = Plug { half_angle, shear_strength: 20e6 };
            let r = plug.static_thickness(848e3, d);
            assert!((plug.strength_left(r, d) / 848e3 - 1.0).abs() < 1e-14, "{half_angle}");
            let tangent = half_angle.to_radians().tan();
            let slab = Slab { thickness, diameter: d, density: rho, shear_strength: 20e6, tangent };
            let law = slab.breaking(&Stage { drag: 3.0, ..Stage::tunnel(848e3, 3.0) }, 2);
            let end = law.end().map_or(f64::NAN, |end| end.value(thickness - r, 0.0));
            assert!(end.abs() < 1e-8, "{half_angle}: {end}");
            let (mass, slope) = slab.moving().joining(thickness - r).unwrap_or((f64::NAN, f64::NAN));
            assert!((mass / plug.mass(r, d, rho) - 1.0).abs() < 1e-14, "{half_angle}");
            assert!(slope < 0.0, "{half_angle}");
        }
    }
}
