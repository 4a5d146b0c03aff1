//! Which nose factor N* and which nose height a nose shape has.
//!
//! ```text
//! N* = (8/d²) ∫ y y'³/(1 + y'²) dx  over the nose,   h = nose height
//! ```
//!
//! The nose acts on the drag alone: the static force of Eq. 5 does not depend on it.
//! Source: Li & Chen (2003), Eq. 2 and 3a-c; heights by geometry.

/// A nose of a shape whose factor is known in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoseShape {
    /// A flat face.
    Flat,
    /// A tangent ogive.
    Ogive {
        /// Radius of the ogive over the diameter, psi >= 1/2; 1/2 is the hemisphere.
        caliber_radius_head: f64,
    },
    /// A sharp cone.
    Cone {
        /// Nose height over the diameter, psi > 0.
        length_ratio: f64,
    },
    /// A spherical cap.
    Spherical {
        /// Radius of the sphere over the diameter, psi >= 1/2; 1/2 is the hemisphere.
        radius_ratio: f64,
    },
}

impl NoseShape {
    /// Nose factor N*, 0 to 1.
    ///
    /// ```text
    /// flat 1    ogive 1/(3 psi) - 1/(24 psi²)    cone 1/(1 + 4 psi²)    cap 1 - 1/(8 psi²)
    /// ```
    ///
    /// The ogive is evaluated as `(8 - 1/psi)/(24 psi)`, so that no square overflows.
    pub fn factor(self) -> f64 {
        match self {
            Self::Flat => 1.0,
            Self::Ogive { caliber_radius_head: psi } => (8.0 - 1.0 / psi) / (24.0 * psi),
            Self::Cone { length_ratio: psi } => 1.0 / (1.0 + 4.0 * psi * psi),
            Self::Spherical { radius_ratio: psi } => 1.0 - 0.125 / psi / psi,
        }
    }

    /// Nose height over the diameter h/d.
    ///
    /// ```text
    /// flat 0    ogive sqrt(psi - 1/4)    cone psi    cap psi - sqrt(psi² - 1/4)
    /// ```
    ///
    /// The cap is evaluated as `(1/4)/(psi + sqrt((psi - 1/2)(psi + 1/2)))`: the difference cancels for flat caps.
    pub fn height_ratio(self) -> f64 {
        match self {
            Self::Flat => 0.0,
            Self::Ogive { caliber_radius_head: psi } => (psi - 0.25).sqrt(),
            Self::Cone { length_ratio: psi } => psi,
            Self::Spherical { radius_ratio: psi } => 0.25 / (psi + (psi - 0.5).sqrt() * (psi + 0.5).sqrt()),
        }
    }

    /// Crater depth in diameters after Li & Chen, `k = 0.707 + h/d` (their Eq. 25).
    ///
    /// A scene states its own k; the paper takes 2 with a flat nose, where this rule gives 0.707.
    pub fn crater_ratio(self) -> f64 {
        0.707 + self.height_ratio()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const HEMISPHERES: [NoseShape; 2] =
        [NoseShape::Ogive { caliber_radius_head: 0.5 }, NoseShape::Spherical { radius_ratio: 0.5 }];

    fn ogive(psi: f64) -> NoseShape {
        NoseShape::Ogive { caliber_radius_head: psi }
    }

    #[test]
    fn factors_are_those_published() {
        // Li & Chen (2003), table of shapes; digits by quadrature of the integral.
        assert_eq!(NoseShape::Flat.factor(), 1.0);
        assert_eq!(ogive(2.0).factor(), 0.15625);
        for (psi, factor) in [(3.0, 0.106_481), (4.25, 0.076_125), (4.5, 0.072_016), (6.0, 0.054_398)] {
            assert_relative_eq!(ogive(psi).factor(), factor, epsilon = 5e-7);
        }
        assert_relative_eq!(NoseShape::Cone { length_ratio: 1.0 }.factor(), 0.2);
        for hemisphere in HEMISPHERES {
            assert_relative_eq!(hemisphere.factor(), 0.5);
        }
    }

    #[test]
    fn crater_ratios_are_those_published() {
        assert_eq!(NoseShape::Flat.crater_ratio(), 0.707);
        for hemisphere in HEMISPHERES {
            assert_relative_eq!(hemisphere.crater_ratio(), 1.207, max_relative = 1e-15);
        }
        for (psi, k) in [(2.0, 2.030), (3.0, 2.365), (4.5, 2.769)] {
            assert_relative_eq!(ogive(psi).crater_ratio(), k, epsilon = 5e-4);
        }
    }

    #[test]
    fn an_almost_flat_cap_keeps_its_height() {
        // psi - sqrt(psi² - 1/4) = 1/(8 psi) + 1/(128 psi³) + ...; the difference as written gives 0 at 1e9.
        assert_relative_eq!(NoseShape::Spherical { radius_ratio: 1e9 }.height_ratio(), 1.25e-10, max_relative = 1e-15);
    }
}
