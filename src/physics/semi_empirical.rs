//! What the semi-empirical model of the paper says: Eq. 11-12, 14 and 15, and the ACE/NDRC relation behind Eq. 15.
//!
//! ```text
//! X/d = sqrt(4 k I/pi)       I <= k pi/4                                                  (Eq. 11)
//! X/d = k/2 + 2 I/pi         otherwise                                                    (Eq. 12)
//! S   = 72 (fc/MPa)^(-1/2)                                                                (Eq. 14)
//! H/d = 3.19 y - 0.718 y²    y = x_p/d <= 1.35;   1.32 + 1.24 y  to 13.5                  (ACE/NDRC)
//! E_c/(d³ fc) = S I(y(H/d))/2  with k = 2                                                 (Eq. 15, unrounded)
//! ```
//!
//! Eq. 11 is printed with I outside the root; only inside it do the branches meet at I = k pi/4. Eq. 15 is Eq. 11-12
//! with the perforation relation inserted; its printed coefficients are roundings of the ones used here, and jump
//! where the branches meet ([`jumps`]). Every formula comes with the range in which it holds, as [`Validity`].
//!
//! Sources: the paper, section 4; Li & Chen (2003), Eq. 15-17 and 21; Kennedy (1976) for the perforation relation.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::scalar::Scalar;
use crate::text::significant;

/// Whether a formula is used inside the range it was made for, and what there is to say about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Validity {
    /// Whether the argument lies in the range of the formula.
    pub valid: bool,
    /// The range, and why it ends there: one sentence for people.
    pub note: String,
}

/// Crater depth in diameters that Eq. 15 assumes.
pub const CRATER_RATIO_OF_EQ15: f64 = 2.0;

/// H/d at the end of the first branch, `3.19 · 1.35 - 0.718 · 1.35²`, exact in decimals.
///
/// The second branch begins lower, at 2.994: in between two depths fit, and the smaller one is taken.
pub const NDRC_FIRST_BRANCH_END: f64 = 2.997_945;

/// First branch of the ACE/NDRC relation, `H/d = a y - b y²`: a and b.
const NDRC_PARABOLA: [f64; 2] = [3.19, 0.718];

/// Second branch, `H/d = a + b y`: a and b.
const NDRC_LINE: [f64; 2] = [1.32, 1.24];

/// y = `x_p/d` where the first branch ends.
const NDRC_JOINT: f64 = 1.35;

/// H/d where the relation ends, `1.32 + 1.24 · 13.5`.
pub const NDRC_END: f64 = 18.06;

/// H/d below which the relation extrapolates: its depth data begin at y of about 0.6.
pub const NDRC_DATA_BEGIN: f64 = 1.7;

/// H/d where the third branch of Eq. 15 begins, exact for k = 2 only.
const THIRD_BRANCH: f64 = 3.8;

/// Static strength over compressive strength S of a concrete of strength fc (Pa) (Eq. 14).
///
/// `S = 72 (fc/MPa)^(-1/2)`, Not finite for fc = 0.
pub fn static_factor(strength: f64) -> f64 {
    static_factor_in(strength)
}

/// As [`static_factor`], in any number type.
pub(crate) fn static_factor_in<S: Scalar>(strength: S) -> S {
    S::from_f64(72.0) / (strength / S::from_f64(1e6)).sqrt()
}

/// As [`static_factor`], and 0 for an air gap, which has no strength for Eq. 14 to go by.
pub(crate) fn static_factor_or_none(strength: f64) -> f64 {
    if strength == 0.0 { 0.0 } else { static_factor(strength) }
}

/// Range of the experiments to which Eq. 14 was fitted: fc from 13.5e6 to 96.7e6 Pa.
pub fn static_factor_validity(strength: f64) -> Validity {
    let note = format!("Eq. 14 was fitted to strengths from 13.5 to 96.7 MPa; this one is {} MPa", strength / 1e6);
    Validity { valid: is_strength_of_eq14(strength), note }
}

/// A shot whose S is left to Eq. 14.
///
/// The fit is that of small projectiles: of shots of 13 kg and 76 mm it predicts 0.57 to 0.69 of the measured depth
/// (Forrestal et al. 2003), and beyond 1200 m/s noses erode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UseOfEq14 {
    /// Compressive strength fc (Pa).
    pub strength: f64,
    /// Diameter d (m).
    pub diameter: f64,
    /// Impact velocity V0 (m/s).
    pub speed: f64,
}

impl UseOfEq14 {
    /// Whether it lies among the experiments of the fit: fc 13.5 to 96.7 MPa, d < 76 mm, V0 < 1200 m/s.
    pub fn is_in_range(self) -> bool {
        is_strength_of_eq14(self.strength) && self.diameter < EQ14_DIAMETER && self.speed < EQ14_SPEED
    }

    /// What lies outside, one sentence each.
    pub fn departures(self) -> Vec<String> {
        let strength = static_factor_validity(self.strength);
        let strength = (!strength.valid).then_some(strength.note);
        let diameter = (self.diameter >= EQ14_DIAMETER).then(|| {
            format!(
                "Eq. 14 was fitted to projectiles below 76 mm; this one has {} mm, and of shots of 13 kg and 76 mm it predicts 0.57 \
                 to 0.69 of the depth",
                significant(1e3 * self.diameter)
            )
        });
        let speed = (self.speed >= EQ14_SPEED).then(|| {
            format!(
                "Eq. 14 was fitted to impact velocities below 1200 m/s; this one is {} m/s",
                significant(self.speed)
            )
        });
        strength.into_iter().chain(diameter).chain(speed).collect()
    }
}

/// Diameter (m) below which those of the fit of Eq. 14 lie.
const EQ14_DIAMETER: f64 = 0.076;

/// Impact velocity (m/s) below which those of the fit of Eq. 14 lie.
const EQ14_SPEED: f64 = 1200.0;

fn is_strength_of_eq14(strength: f64) -> bool {
    (13.5e6..=96.7e6).contains(&strength)
}

/// Depth X/d of Eq. 11-12 at impact function `impact`, for crater depth `crater_ratio` = k > 0.
pub fn depth_ratio(impact: f64, crater_ratio: f64) -> f64 {
    let k = crater_ratio;
    if impact <= k * FRAC_PI_4 { (k * impact / FRAC_PI_4).sqrt() } else { 0.5 * k + impact / FRAC_PI_2 }
}

/// Impact function I that reaches the depth X/d = `depth_ratio` by Eq. 11-12: the inverse of [`depth_ratio`].
pub fn impact_function(depth_ratio: f64, crater_ratio: f64) -> f64 {
    let (y, k) = (depth_ratio, crater_ratio);
    if y <= k { FRAC_PI_4 * y * (y / k) } else { FRAC_PI_2 * (y - 0.5 * k) }
}

/// How far Eq. 11-12 is from the equation of motion at finite N, by the first term in 1/N, relative to X/d.
///
/// ```text
/// crater: (k pi/4 - I)/(2 N)      tunnel: -(I² - (k pi/4)²)/(pi N) / (X/d)
/// ```
///
/// The sign is that of the exact depth less Eq. 11-12. Derived, and O(1/N²) from the truth.
pub fn model_difference(impact: f64, geometry: f64, crater_ratio: f64) -> f64 {
    let at_crater_end = crater_ratio * FRAC_PI_4;
    if impact <= at_crater_end {
        0.5 * (at_crater_end - impact) / geometry
    } else {
        (at_crater_end - impact) * (at_crater_end + impact) / (PI * geometry) / depth_ratio(impact, crater_ratio)
    }
}

/// Penetration y = `x_p/d` at which a target of thickness H/d counts as perforated: the ACE/NDRC relation, inverted.
///
/// ```text
/// H/d <= 2.997945: y = (H/d / 0.718)/(a + sqrt(a² - H/d / 0.718)),  a = 3.19/1.436;   else (H/d - 1.32)/1.24
/// ```
///
/// The quotient is the smaller root of the quadratic without its cancellation as H/d -> 0, where y -> (H/d)/3.19.
/// Where two depths fit, from 2.994 to 2.997945, the smaller one (first branch) is taken. Beyond 18.06 the second
/// branch is continued (see [`perforation_validity`]).
pub fn perforating_depth_ratio<S: Scalar>(thickness_ratio: S) -> S {
    let (h, [a, b], [c, d]) = (thickness_ratio, NDRC_PARABOLA, NDRC_LINE);
    if h.value() <= NDRC_FIRST_BRANCH_END {
        let [a, b] = [S::decimal(a), S::decimal(b)];
        let a = a / (b + b);
        let scaled = h / b;
        scaled / (a + (a * a - scaled).sqrt())
    } else {
        (h - S::decimal(c)) / S::decimal(d)
    }
}

/// Thickness H/d that a penetration y = `x_p/d` just perforates: the ACE/NDRC relation.
///
/// ```text
/// H/d = 3.19 y - 0.718 y²   y <= 1.35;     1.32 + 1.24 y  beyond
/// ```
///
/// The inverse of [`perforating_depth_ratio`]: just beyond y = 1.35 the second branch begins below the end of the first,
/// which is as thick as the smaller of the two depths perforates, and holds until the second branch is above it.
/// Beyond y = 13.5 the second branch continues.
pub fn perforated_thickness_ratio(depth_ratio: f64) -> f64 {
    let (y, [a, b], [c, d]) = (depth_ratio, NDRC_PARABOLA, NDRC_LINE);
    if y <= NDRC_JOINT { y * (a - b * y) } else { (c + d * y).max(NDRC_FIRST_BRANCH_END) }
}

/// d(H/d)/dy of [`perforated_thickness_ratio`].
pub fn perforation_slope(depth_ratio: f64) -> f64 {
    let ([a, b], [_, d]) = (NDRC_PARABOLA, NDRC_LINE);
    if depth_ratio <= NDRC_JOINT { a - 2.0 * b * depth_ratio } else { d }
}

/// Range of the ACE/NDRC relation and of unrounded Eq. 15: 0 < H/d <= 18.06.
pub fn perforation_validity(thickness_ratio: f64) -> Validity {
    range_validity(thickness_ratio, thickness_ratio <= NDRC_END, "H/d = 18.06 (y = 13.5)")
}

/// Range of Eq. 15 as printed: 0 < H/d < 18.
pub fn eq15_printed_validity(thickness_ratio: f64) -> Validity {
    range_validity(thickness_ratio, thickness_ratio < 18.0, "H/d = 18")
}

fn range_validity(thickness_ratio: f64, below_end: bool, end: &str) -> Validity {
    let h = thickness_ratio;
    let is_target = h > 0.0;
    let note = if !is_target {
        "there is nothing to perforate: H/d must be above 0".to_owned()
    } else if !below_end {
        format!("H/d = {h} lies beyond the end of the relation, {end}")
    } else if h < NDRC_DATA_BEGIN {
        format!("H/d = {h} lies below {NDRC_DATA_BEGIN}, where the relation extrapolates its data")
    } else {
        format!("H/d lies between 0 and {end}")
    };
    Validity { valid: is_target && below_end, note }
}

/// Critical energy `E_c/(S d³ fc)` of Eq. 15 as printed, three branches with rounded coefficients.
///
/// Multiply by S for the ordinate of Figure 4. Not monotone and not continuous ([`jumps`]); at H/d -> 0 it tends to
/// 5.2e-8 in place of 0, since its difference cancels: that is what is printed. Beyond 18 the last branch continues.
pub fn eq15_printed(thickness_ratio: f64) -> f64 {
    let h = thickness_ratio;
    if h <= 3.0 { printed_first(h) } else { printed_beyond_first(h) }
}

fn printed_first(h: f64) -> f64 {
    let root = 2.222 - (4.935 - 1.393 * h).sqrt();
    0.196 * root * root
}

fn printed_beyond_first(h: f64) -> f64 {
    if h <= THIRD_BRANCH { 0.128 * (h - 1.320) * (h - 1.320) } else { 0.633 * (h - 2.560) }
}

/// Critical energy `E_c/(S d³ fc)` of Eq. 15 with unrounded coefficients: Eq. 11-12 at k = 2 with the ACE/NDRC
/// relation, `I(y(H/d))/2`.
///
/// ```text
/// (pi/16) y²,  y from the quadratic   H/d <= 2.997945
/// pi/(16 · 1.24²) (H/d - 1.32)²       to 3.8
/// pi/(4 · 1.24) (H/d - 2.56)          beyond
/// ```
///
/// Continuous with its slope at 3.8; jumps by +0.47 % at 2.997945, where the perforation relation does.
pub fn eq15_unrounded(thickness_ratio: f64) -> f64 {
    0.5 * impact_function(perforating_depth_ratio(thickness_ratio), CRATER_RATIO_OF_EQ15)
}

/// The two sides of a place where branches of Eq. 15 meet, `E_c/(S d³ fc)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// Where the branches meet, H/d.
    pub thickness_ratio: f64,
    /// Value of the branch that ends there.
    pub below: f64,
    /// Value of the branch that begins there.
    pub above: f64,
}

/// The jumps of Eq. 15 as printed, at H/d = 3 and 3.8: +0.76 % and -0.30 %.
pub fn jumps() -> [Jump; 2] {
    [
        Jump { thickness_ratio: 3.0, below: printed_first(3.0), above: printed_beyond_first(3.0) },
        Jump {
            thickness_ratio: THIRD_BRANCH,
            below: printed_beyond_first(THIRD_BRANCH),
            above: printed_beyond_first(THIRD_BRANCH.next_up()),
        },
    ]
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn branches_of_eq_11_12_meet_at_the_crater_end_with_equal_slope() {
        for k in [0.707, 2.0, 2.365] {
            let end = k * FRAC_PI_4;
            assert_relative_eq!(depth_ratio(end, k), k, max_relative = 2e-16);
            assert_relative_eq!(depth_ratio(end.next_up(), k), k, max_relative = 1e-15);
            let step = 1e-6;
            let below = (depth_ratio(end, k) - depth_ratio(end - step, k)) / step;
            let above = (depth_ratio(end + step, k) - depth_ratio(end, k)) / step;
            assert_relative_eq!(below, above, max_relative = 1e-5);
        }
    }

    #[test]
    fn impact_function_inverts_depth() {
        for k in [0.707, 2.0, 5.0] {
            for exponent in -40..40 {
                let impact = 10_f64.powf(f64::from(exponent) / 8.0);
                assert_relative_eq!(impact_function(depth_ratio(impact, k), k), impact, max_relative = 2e-15);
            }
        }
    }

    #[test]
    fn static_factor_is_eq_14_in_megapascals() {
        assert_eq!(static_factor(36e6), 12.0);
        assert_relative_eq!(static_factor(35.2e6), 12.135_597_524_338_4, max_relative = 1e-14);
        assert!(static_factor_validity(36e6).valid);
        assert!(!static_factor_validity(150e6).valid && !static_factor_validity(10e6).valid);
    }

    #[test]
    fn each_departure_from_the_experiments_of_eq_14_is_said_at_its_edge() {
        let within = UseOfEq14 { strength: 36e6, diameter: 0.0759, speed: 1199.0 };
        assert!(within.is_in_range() && within.departures().is_empty());
        for (outside, said) in [
            (UseOfEq14 { strength: 96.8e6, ..within }, "96.8 MPa"),
            (UseOfEq14 { diameter: 0.0762, ..within }, "76.2000 mm"),
            (UseOfEq14 { speed: 1200.0, ..within }, "1200.00 m/s"),
        ] {
            let text = outside.departures();
            assert!(!outside.is_in_range() && text.len() == 1 && text[0].contains(said), "{text:?}");
        }
        assert_eq!(UseOfEq14 { strength: 1e6, diameter: 0.3, speed: 2e3 }.departures().len(), 3);
    }

    /// The relation as it is printed: H/d that the penetration y perforates.
    fn printed_relation(y: f64) -> f64 {
        if y <= 1.35 { y * (3.19 - 0.718 * y) } else { 1.32 + 1.24 * y }
    }

    #[test]
    fn perforating_depth_inverts_the_ndrc_relation_on_both_branches() {
        for step in 1..=1000 {
            let y = f64::from(step) * 1.35e-3;
            // Near the top of the parabola the inverse loses digits by itself: dln y/dln H is at most 1.6 here.
            assert_relative_eq!(perforating_depth_ratio(printed_relation(y)), y, max_relative = 2e-15);
        }
        for y in [1e-300, 0.5, 1.35, 1.3532, 13.5] {
            assert_relative_eq!(perforated_thickness_ratio(y), printed_relation(y), max_relative = 2e-16);
        }
        // 1.32 + 1.24 · 1.351 = 2.99524 lies below the end of the first branch.
        assert_eq!(perforated_thickness_ratio(1.351), NDRC_FIRST_BRANCH_END);
        for y in [1.3532, 1.4, 2.0, 5.0, 13.5] {
            assert_relative_eq!(perforating_depth_ratio(printed_relation(y)), y, max_relative = 1e-15);
        }
    }

    #[test]
    fn perforating_depth_does_not_cancel_on_thin_targets_and_is_the_smaller_where_two_fit() {
        // y = h/3.19 (1 + 0.718 h/3.19² + ...)
        for h in [1e-300, 1e-20, 1e-12] {
            assert_relative_eq!(perforating_depth_ratio(h), h / 3.19, max_relative = 1e-12);
        }
        assert_eq!(perforating_depth_ratio(0.0), 0.0);
        assert_relative_eq!(perforating_depth_ratio(2.997_945), 1.35, max_relative = 1e-15);
        assert!(perforating_depth_ratio(2.994) < 1.35 && perforating_depth_ratio(2.9979) < 1.35);
        assert_relative_eq!(perforating_depth_ratio(2.997_945_f64.next_up()), 1.677_945 / 1.24, max_relative = 1e-14);
    }

    #[test]
    fn unrounded_eq15_has_the_coefficients_of_theory() {
        // E/(S d³ fc) of each branch, coefficients computed apart: pi/16, 3.19/1.436, 1/0.718; 0.1276987...; 0.6333856...
        let first = |h: f64| {
            0.196_349_540_849_362_08 * (2.221_448_467_966_57 - (4.934_833_295_831_04 - h / 0.718).sqrt()).powi(2)
        };
        for h in [1.0, 2.0, 2.99] {
            assert_relative_eq!(eq15_unrounded(h), first(h), max_relative = 1e-13);
        }
        for h in [3.0, 3.5, 3.8] {
            assert_relative_eq!(
                eq15_unrounded(h),
                0.127_698_712_831_271 * (h - 1.32) * (h - 1.32),
                max_relative = 1e-14
            );
        }
        for h in [3.81, 10.0, 18.06] {
            assert_relative_eq!(eq15_unrounded(h), 0.633_385_615_643_103 * (h - 2.56), max_relative = 1e-14);
        }
        assert_relative_eq!(eq15_unrounded(3.8), FRAC_PI_4, max_relative = 1e-15);
        // The branches as printed beside: 3.0 gives 0.3604168471 on the second branch.
        assert_relative_eq!(eq15_unrounded(3.0), 0.360_416_847_1, max_relative = 1e-10);
    }

    #[test]
    fn printed_eq15_gives_the_printed_values() {
        for (h, energy) in
            [(1.0, 0.022_655), (2.0, 0.112_037), (3.0, 0.358_543), (3.8, 0.787_251), (5.0, 1.544_52), (18.0, 9.773_52)]
        {
            assert_relative_eq!(eq15_printed(h), energy, epsilon = 6e-7);
        }
        assert_relative_eq!(eq15_printed(0.0), 5.2e-8, max_relative = 0.01);
    }

    #[test]
    fn printed_eq15_jumps_by_what_theory_says_and_unrounded_does_not() {
        let [first, second] = jumps();
        let relative = |jump: Jump| (jump.above - jump.below) / jump.below;
        assert_relative_eq!(first.above - first.below, 0.002_723_75, epsilon = 5e-9);
        assert_relative_eq!(relative(first), 0.007_597, epsilon = 5e-7);
        assert_relative_eq!(second.above - second.below, -0.002_331_2, epsilon = 5e-9);
        assert_relative_eq!(relative(second), -0.002_961, epsilon = 5e-7);
        let unrounded = |h: f64| eq15_unrounded(h.next_up()) / eq15_unrounded(h) - 1.0;
        assert_relative_eq!(unrounded(3.8), 0.0, epsilon = 1e-15);
        assert_relative_eq!(unrounded(NDRC_FIRST_BRANCH_END), 0.004_7, epsilon = 5e-5);
    }

    #[test]
    fn ranges_end_where_the_relations_do() {
        assert!(perforation_validity(18.06).valid && !perforation_validity(18.07).valid);
        assert!(eq15_printed_validity(17.99).valid && !eq15_printed_validity(18.0).valid);
        assert!(!perforation_validity(0.0).valid && !perforation_validity(f64::NAN).valid);
        let thin = perforation_validity(1.0);
        assert!(thin.valid && thin.note.contains("extrapolates"), "{}", thin.note);
        assert!(perforation_validity(1.7_f64.next_down()).note.contains("extrapolates"));
        assert_eq!(perforation_validity(1.7).note, "H/d lies between 0 and H/d = 18.06 (y = 13.5)");
    }
}
