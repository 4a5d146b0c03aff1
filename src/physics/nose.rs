//! Which nose factor N* and which nose height a nose shape has.
//!
//! ```text
//! N* = (8/d²) ∫ y y'³/(1 + y'²) dx  over the nose,   h = nose height
//! ```
//!
//! The nose acts on the drag alone: the static force of Eq. 5 does not depend on it.
//! Source: Li & Chen (2003), Eq. 2 and 3a-c; heights by geometry.

use super::scalar::Scalar;

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
    /// A tangent ogive, cut off flat.
    TruncatedOgive {
        /// Radius of the ogive over the diameter, psi >= 1/2.
        caliber_radius_head: f64,
        /// Diameter of the flat over the diameter, t = 0 to 1.
        tip_ratio: f64,
    },
    /// A cone, cut off flat.
    TruncatedCone {
        /// Height of what is left over the diameter, psi > 0.
        length_ratio: f64,
        /// Diameter of the flat over the diameter, t = 0 to 1.
        tip_ratio: f64,
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
    /// A flat of t d in front adds t², and the face behind it ends at the angle a to the axis, cos a = 1 - (1 - t)/(2 psi):
    ///
    /// ```text
    /// truncated ogive   t² + 8 psi ((1/2 - psi) (2/3 - cos a + cos³a/3) + psi sin⁴a/4)
    /// truncated cone    t² + (1 - t²)/(1 + (2 psi/(1 - t))²)
    /// ```
    ///
    /// The ogive is evaluated as `(8 - 1/psi)/(24 psi)`, so that no square overflows.
    pub fn factor(self) -> f64 {
        let ratios = match self {
            Self::Flat => [0.0; 2],
            Self::Ogive { caliber_radius_head: psi }
            | Self::Cone { length_ratio: psi }
            | Self::Spherical { radius_ratio: psi } => [psi, 0.0],
            Self::TruncatedOgive { caliber_radius_head: psi, tip_ratio: t }
            | Self::TruncatedCone { length_ratio: psi, tip_ratio: t } => [psi, t],
        };
        self.factor_in(ratios)
    }

    /// As [`NoseShape::factor`], in the number type of psi and t, which stand for those of the shape.
    pub(crate) fn factor_in<S: Scalar>(self, [psi, t]: [S; 2]) -> S {
        let number = S::from_f64;
        match self {
            Self::Flat => number(1.0),
            Self::Ogive { .. } => (number(8.0) - number(1.0) / psi) / (number(24.0) * psi),
            Self::Cone { .. } => number(1.0) / (number(1.0) + number(4.0) * psi * psi),
            Self::TruncatedOgive { .. } => {
                let one = number(1.0);
                // With u = 1 - cos a: 2/3 - cos a + cos³a/3 = u² (1 - u/3), sin²a = u (2 - u); nothing cancels.
                let u = number(0.5) * (one - t) / psi;
                let [rest, wide] = [one - u / number(3.0), number(2.0) - u];
                t * t + number(8.0) * psi * u * u * ((number(0.5) - psi) * rest + number(0.25) * psi * wide * wide)
            }
            Self::TruncatedCone { .. } => {
                let one = number(1.0);
                let (flat, slope) = (t * t, number(2.0) * psi / (one - t));
                flat + (one - flat) / (one + slope * slope)
            }
            Self::Spherical { .. } => number(1.0) - number(0.125) / psi / psi,
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
            Self::Cone { length_ratio: psi } | Self::TruncatedCone { length_ratio: psi, .. } => psi,
            Self::TruncatedOgive { caliber_radius_head: psi, tip_ratio: t } => {
                let u = 0.5 * (1.0 - t) / psi;
                psi * (u * (2.0 - u)).sqrt()
            }
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
        assert_eq!(ogive(2.0).factor(), 0.156_25);
        for (psi, factor) in [(3.0, 0.106_481), (4.25, 0.076_125), (4.5, 0.072_016), (6.0, 0.054_398)] {
            assert_relative_eq!(ogive(psi).factor(), factor, epsilon = 5e-7);
        }
        assert_relative_eq!(NoseShape::Cone { length_ratio: 1.0 }.factor(), 0.2);
        for hemisphere in HEMISPHERES {
            assert_relative_eq!(hemisphere.factor(), 0.5);
        }
    }

    const TRUNCATED: [(NoseShape, f64, f64); 5] = [
        (NoseShape::TruncatedOgive { caliber_radius_head: 3.0, tip_ratio: 0.4 }, 0.2298, 1.307_669_683_062_202),
        (NoseShape::TruncatedOgive { caliber_radius_head: 1.5, tip_ratio: 0.7 }, 0.536_45, 0.653_834_841_531_101),
        (
            NoseShape::TruncatedOgive { caliber_radius_head: 0.5, tip_ratio: 0.25 },
            0.501_953_125,
            0.484_122_918_275_927_1,
        ),
        (NoseShape::TruncatedCone { length_ratio: 1.5, tip_ratio: 0.4 }, 0.192_307_692_307_692_32, 1.5),
        (NoseShape::TruncatedCone { length_ratio: 0.3, tip_ratio: 0.8 }, 0.676, 0.3),
    ];

    /// mpmath, 40 digits: `t² + 8 quad(y y'^3/(1 + y'^2))` over the face behind the flat, and its height by geometry.
    #[test]
    fn factors_and_heights_of_truncated_noses_are_those_of_the_integral() {
        for (nose, factor, height) in TRUNCATED {
            assert_relative_eq!(nose.factor(), factor, max_relative = 1e-15);
            assert_relative_eq!(nose.height_ratio(), height, max_relative = 1e-15);
        }
        // Without a flat they are the whole noses.
        for psi in [0.5, 2.0, 6.0] {
            let cut = NoseShape::TruncatedOgive { caliber_radius_head: psi, tip_ratio: 0.0 };
            assert_relative_eq!(cut.factor(), ogive(psi).factor(), max_relative = 1e-14);
            assert_relative_eq!(cut.height_ratio(), ogive(psi).height_ratio(), max_relative = 1e-15);
        }
        let [whole, cut] =
            [NoseShape::Cone { length_ratio: 1.5 }, NoseShape::TruncatedCone { length_ratio: 1.5, tip_ratio: 0.0 }];
        assert_eq!(whole.factor(), cut.factor());
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
