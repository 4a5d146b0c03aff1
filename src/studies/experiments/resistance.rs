//! Which S do measured depths show, and does it predict a depth that it was not fitted to?
//!
//! Each depth has one S at which the model predicts it exactly, by the inverse of Li & Chen's depth at finite N. Eq. 14 has the
//! form `S = c (fc/MPa)^(-1/2)` with c = 72; the fit keeps the form:
//!
//! ```text
//! ln c = mean of ln (S_i √(fc_i/MPa))       interval by Student's t;  R = S fc of one strength likewise
//! ```
//!
//! Left out one at a time, each depth is predicted with the c of the others. That is the scatter a user of the fit has to expect.
//! Depths below half a diameter do not count: the crater law does not hold there.

use serde::Serialize;

use super::statistics::Sample;
use super::{Comparison, grouped};
use crate::physics::{CraterStiffness, semi_empirical};
use crate::studies::applicability::{depth_ratio, impact_at};

use super::ballistic_limit::Estimate;

/// Fewest depths of a fit.
const TESTS_MIN: usize = 3;

/// Strengths within this ratio count as one concrete.
const ONE_STRENGTH: f64 = 1.1;

/// The S of a set of depths.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct ResistanceFit {
    /// Set.
    pub set: String,
    /// Depths.
    #[serde(rename = "shots")]
    pub tests: usize,
    /// c of `S = c (fc/MPa)^(-1/2)`, 72 in Eq. 14.
    pub coefficient: Estimate,
    /// S; `null` where the strengths of the set differ by more than 10 %.
    #[serde(rename = "S")]
    pub static_factor: Option<Estimate>,
    /// R = S fc (Pa), with S.
    #[serde(rename = "R_pa")]
    pub strength_pa: Option<Estimate>,
    /// Predicted over measured depth with the c of all.
    pub fitted: Sample,
    /// Predicted over measured depth, each with the c of the others.
    pub left_out: Sample,
}

/// A depth and the impact function that gives it.
struct Shown {
    /// S √(fc/MPa).
    coefficient: f64,
    static_factor: f64,
    strength: f64,
    /// I of S = 1.
    impact: f64,
    geometry: Option<f64>,
    crater_ratio: f64,
    depth_ratio: f64,
}

impl Shown {
    fn of(comparison: &Comparison) -> Option<Self> {
        let concrete = &comparison.experiment.concrete;
        if comparison.is_shallow() || concrete.crater_stiffness != CraterStiffness::Continuous {
            return None;
        }
        let (d, strength) = (concrete.diameter, concrete.strength);
        let Comparison { geometry, crater_ratio, .. } = *comparison;
        let depth_ratio = comparison.experiment.measured_depth_m / d;
        let impact = comparison.impact * concrete.static_factor;
        let static_factor = impact / impact_at(depth_ratio, geometry, crater_ratio);
        let coefficient = static_factor * (strength / 1e6).sqrt();
        (coefficient > 0.0 && coefficient.is_finite()).then_some(Self {
            coefficient,
            static_factor,
            strength,
            impact,
            geometry,
            crater_ratio,
            depth_ratio,
        })
    }

    /// Predicted over measured depth with `coefficient`.
    fn ratio(&self, coefficient: f64) -> f64 {
        let impact = self.impact * (self.strength / 1e6).sqrt() / coefficient;
        let predicted = match self.geometry {
            Some(geometry) => depth_ratio(impact, geometry, self.crater_ratio),
            None => semi_empirical::depth_ratio(impact, self.crater_ratio),
        };
        predicted / self.depth_ratio
    }
}

/// The S at which the depth of `comparison` is exact over that of Eq. 14; `None` below half a diameter.
pub(in crate::studies) fn shown_over_eq14(comparison: &Comparison) -> Option<f64> {
    Shown::of(comparison).map(|shown| shown.coefficient / 72.0)
}

/// The exponential of the mean of logarithms, with its interval.
fn geometric(values: impl Iterator<Item = f64>) -> Option<Estimate> {
    let sample = Sample::of(&values.map(f64::ln).collect::<Vec<_>>())?;
    Some(Estimate { value: sample.mean.exp(), interval95: sample.mean95?.map(f64::exp) })
}

/// The fit of each set of three depths and more.
pub fn fits(comparisons: &[Comparison]) -> Vec<ResistanceFit> {
    let sets = grouped(comparisons, |comparison| comparison.experiment.set.clone()).into_iter();
    sets.filter_map(|(set, members)| fit(set, &members)).collect()
}

fn fit(set: String, members: &[&Comparison]) -> Option<ResistanceFit> {
    let shown: Vec<Shown> = members.iter().filter_map(|comparison| Shown::of(comparison)).collect();
    if shown.len() < TESTS_MIN {
        return None;
    }
    let coefficient = geometric(shown.iter().map(|shown| shown.coefficient))?;
    let logs: f64 = shown.iter().map(|shown| shown.coefficient.ln()).sum();
    let others = |left_out: &Shown| ((logs - left_out.coefficient.ln()) / (shown.len() - 1) as f64).exp();
    let strengths = || shown.iter().map(|shown| shown.strength);
    let is_one = strengths().fold(0.0, f64::max) <= ONE_STRENGTH * strengths().fold(f64::INFINITY, f64::min);
    let of_one = |value: fn(&Shown) -> f64| is_one.then(|| geometric(shown.iter().map(value))).flatten();
    let ratios =
        |by: &dyn Fn(&Shown) -> f64| Sample::of(&shown.iter().map(|shown| shown.ratio(by(shown))).collect::<Vec<_>>());
    Some(ResistanceFit {
        set,
        tests: shown.len(),
        coefficient,
        static_factor: of_one(|shown| shown.static_factor),
        strength_pa: of_one(|shown| shown.static_factor * shown.strength),
        fitted: ratios(&|_| coefficient.value)?,
        left_out: ratios(&others)?,
    })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::integrators::Taylor;
    use crate::studies::experiments::{compare, depths, shot};

    /// mpmath, 40 digits: S of each depth by bisection of Li & Chen's depth at finite N; mean and Student's interval of its
    /// logarithm; the depth of each with the mean, and with the mean of the others.
    #[test]
    fn the_fit_and_its_leave_one_out_check_are_those_in_forty_digits() {
        let table = "M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,V0_m_s,depth_mm\n\
                     1.6,30.5,ogive,3,23,2040,300,330\n1.6,30.5,ogive,3,23,2040,400,520\n\
                     1.6,30.5,ogive,3,24,2040,500,780\n1.6,30.5,ogive,3,24,2040,600,1010\n";
        let shots = shot::read("own.csv", table.as_bytes(), "own").unwrap().shots;
        let comparisons = compare(&depths(&shots), None, &[], &Taylor::default()).unwrap();
        let [fit] = &fits(&comparisons)[..] else { unreachable!("one set") };
        for (found, expected) in
            [fit.coefficient, fit.static_factor.unwrap(), fit.strength_pa.unwrap()].into_iter().zip(ESTIMATES)
        {
            let [low, high] = found.interval95;
            for (found, expected) in [found.value, low, high].into_iter().zip(expected) {
                assert_relative_eq!(found, expected, max_relative = 1e-12);
            }
        }
        for (found, expected) in [fit.fitted, fit.left_out].into_iter().zip(RATIOS) {
            assert_relative_eq!(found.mean, expected.0, max_relative = 1e-12);
            assert_relative_eq!(found.deviation.unwrap(), expected.1, max_relative = 1e-12);
        }
        assert!(fits(&comparisons[..2]).is_empty());
    }

    /// Without drag S goes as V²/(X - k d/2) in the tunnel, Eq. 12.
    #[test]
    fn without_drag_the_fit_is_that_of_eq_12() {
        let rows = [(300.0, 0.12), (320.0, 0.14), (350.0, 0.16)];
        let row = |(v, x): (f64, f64)| format!("0.5,25,flat,40,0,{v},{}\n", 1e3 * x);
        let table = "M_kg,d_mm,nose,fc_MPa,rho_kg_m3,V0_m_s,depth_mm\n".to_owned() + &rows.map(row).concat();
        let shots = shot::read("own.csv", table.as_bytes(), "own").unwrap().shots;
        let fit = &fits(&compare(&depths(&shots), None, &[], &Taylor::default()).unwrap())[0];
        let factor = |(v, x): (f64, f64)| {
            let impact = std::f64::consts::FRAC_PI_2 * (x / 0.025 - 0.5 * 0.707);
            0.5 * v * v / (40e6 * 0.025_f64.powi(3) * impact)
        };
        let expected = rows.map(factor).iter().product::<f64>().cbrt();
        assert_relative_eq!(fit.static_factor.unwrap().value, expected, max_relative = 1e-13);
        assert!(fit.fitted.mean.is_finite() && fit.left_out.deviation.unwrap() > 0.0);
    }

    /// c, S and R (Pa), each with its interval.
    const ESTIMATES: [[f64; 3]; 3] = [
        [71.073_713_496_803_99, 66.462_744_315_243_65, 76.004_576_733_482_71],
        [14.663_047_378_665_102, 13.799_063_993_832_295, 15.581_126_265_163_874],
        [344_503_609.636_815_85, 318_672_693.798_715_4, 372_428_323.362_276_14],
    ];

    /// Mean and sample deviation of predicted over measured depth, fitted and left out.
    const RATIOS: [(f64, f64); 2] =
        [(1.000_628_024_537_785_7, 0.036_916_552_988_112_6), (1.001_063_556_243_500_4, 0.049_277_878_449_437_124)];
}
