//! Means, standard deviations and probabilities of normal samples, with intervals of 95 %.
//!
//! ```text
//! mean     m ± t s/√n                                    Student's t with n - 1 degrees of freedom
//! s        s √((n-1)/χ²(0.025)) to s √((n-1)/χ²(0.975))  upper tails of χ² with n - 1 degrees of freedom
//! ```
//!
//! s is the sample standard deviation, with n - 1 in the divisor.

use serde::Serialize;

use crate::studies::order::{bisect, student_t};

/// Two-sided level of every interval here: 95 %.
pub(super) const LEVEL: f64 = 0.05;

/// The quantile of chi-squared with one degree of freedom at 95 %, by which a likelihood ratio is judged.
pub(super) const CHI_SQUARED_95: f64 = 3.841_458_820_694_124;

/// Modified deviation beyond which a value is an outlier (Iglewicz and Hoaglin 1993).
const OUTLIER: f64 = 3.5;

/// Values behind which an outlier can be distinguished from scatter.
const OUTLIER_TESTS_MIN: usize = 5;

/// Mean and scatter of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Sample {
    /// Number of values.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// 95 % interval of the mean; `None` for one value.
    pub mean95: Option<[f64; 2]>,
    /// Sample standard deviation; `None` for one value.
    pub deviation: Option<f64>,
    /// 95 % interval of the standard deviation; `None` for one value.
    pub deviation95: Option<[f64; 2]>,
}

impl Sample {
    /// Of `values`; `None` without any.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        if count == 0 {
            return None;
        }
        let n = count as f64;
        let mean = values.iter().sum::<f64>() / n;
        if count == 1 {
            return Some(Self { count, mean, mean95: None, deviation: None, deviation95: None });
        }
        let dof = count - 1;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = (squares / dof as f64).sqrt();
        let half = student_t(LEVEL, dof) * deviation / n.sqrt();
        let end = |tail: f64| deviation * (dof as f64 / chi_squared(tail, dof)).sqrt();
        Some(Self {
            count,
            mean,
            mean95: Some([mean - half, mean + half]),
            deviation: Some(deviation),
            deviation95: Some([end(0.5 * LEVEL), end(1.0 - 0.5 * LEVEL)]),
        })
    }
}

/// Middle value of `sorted`, which holds at least one.
pub(super) fn median(sorted: &[f64]) -> f64 {
    0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2])
}

/// Which of `values` are outliers: `0.6745 |x - median|` above 3.5 times the median of the deviations.
///
/// Median and deviations are blind to the outliers themselves, as mean and standard deviation are not. None of fewer than five.
pub(super) fn outliers(values: &[f64]) -> Vec<bool> {
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    if values.len() < OUTLIER_TESTS_MIN {
        return vec![false; values.len()];
    }
    let middle = median(&sorted(values.to_vec()));
    let deviation = median(&sorted(values.iter().map(|value| (value - middle).abs()).collect()));
    values.iter().map(|value| 0.6745 * (value - middle).abs() > OUTLIER * deviation).collect()
}

/// The value that chi-squared with `dof` degrees of freedom, 1 and more, exceeds with probability `tail`.
pub(super) fn chi_squared(tail: f64, dof: usize) -> f64 {
    let n = dof as f64;
    let most = n + 40.0 * n.sqrt() + 80.0;
    bisect(0.0, most, 100, |x| chi_squared_tail(x, dof) > tail)
}

/// Probability that chi-squared with `dof` degrees of freedom exceeds `x` (Abramowitz and Stegun 26.4.4, 26.4.5).
fn chi_squared_tail(x: f64, dof: usize) -> f64 {
    let h = 0.5 * x;
    let odd = dof % 2 == 1;
    let (first, sum) = if odd { (0.5, libm::erfc(h.sqrt())) } else { (0.0, 0.0) };
    if h == 0.0 {
        return 1.0;
    }
    // e^-h h^a/Γ(a+1) of a = first, first + 1, ... below dof/2; each by logarithms, since the product would underflow.
    let term = |index: usize| {
        let a = first + index as f64;
        (a * h.ln() - h - libm::lgamma(a + 1.0)).exp()
    };
    (0..dof / 2).map(term).sum::<f64>() + sum
}

/// Logarithm of the probability Φ(z) that a standard normal value is below `z`, and its derivative `φ(z)/Φ(z)`.
///
/// Below -35 by the asymptotic series of Φ, whose next term is 2e-15 there; `erfc` vanishes further down.
pub(super) fn ln_normal(z: f64) -> (f64, f64) {
    use std::f64::consts::{FRAC_1_SQRT_2, PI};
    let ln_density = -0.5 * z * z - 0.5 * (2.0 * PI).ln();
    if z <= -35.0 {
        let w = 1.0 / (z * z);
        let series = -w * (1.0 - 3.0 * w * (1.0 - 5.0 * w * (1.0 - 7.0 * w * (1.0 - 9.0 * w))));
        return (ln_density - (-z).ln() + series.ln_1p(), -z / (1.0 + series));
    }
    // Near one the logarithm is that of what is missing.
    let ln_probability = if z > 1.0 {
        (-0.5 * libm::erfc(z * FRAC_1_SQRT_2)).ln_1p()
    } else {
        (0.5 * libm::erfc(-z * FRAC_1_SQRT_2)).ln()
    };
    (ln_probability, (ln_density - ln_probability).exp())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// mpmath, 40 digits: `findroot(gammainc(n/2, x/2, regularized=True) - p)`.
    #[test]
    fn quantiles_of_chi_squared_are_those_in_forty_digits() {
        for (tail, dof, expected) in CHI_SQUARED {
            assert_relative_eq!(chi_squared(tail, dof), expected, max_relative = 1e-12);
        }
        assert_relative_eq!(chi_squared(0.05, 1), CHI_SQUARED_95, max_relative = 1e-13);
    }

    /// mpmath, 40 digits: `log(ncdf(z))` and `npdf(z)/ncdf(z)`.
    #[test]
    fn the_normal_distribution_is_that_in_forty_digits() {
        for (z, ln_probability, slope) in NORMAL {
            let (found, found_slope) = ln_normal(z);
            assert_relative_eq!(found, ln_probability, max_relative = 1e-13);
            assert_relative_eq!(found_slope, slope, max_relative = 2e-13);
        }
    }

    /// mpmath: mean, deviation with n - 1, Student's t and chi-squared by `findroot` of their tails.
    #[test]
    fn mean_and_deviation_have_the_intervals_of_student_and_chi_squared() {
        let sample = Sample::of(&[0.98, 1.12, 0.87, 1.05, 1.01]).unwrap();
        let ([low, high], [least, most]) = (sample.mean95.unwrap(), sample.deviation95.unwrap());
        for (found, expected) in
            [sample.mean, sample.deviation.unwrap(), low, high, least, most].into_iter().zip(SAMPLE)
        {
            assert_relative_eq!(found, expected, max_relative = 1e-12);
        }
        let one = Sample::of(&[2.0]).unwrap();
        assert!(one.deviation.is_none() && one.mean95.is_none() && Sample::of(&[]).is_none());
    }

    #[test]
    fn an_outlier_is_seen_by_what_is_blind_to_it() {
        assert_eq!(outliers(&[1.0, 1.02, 0.99, 1.01, 1.7]), [false, false, false, false, true]);
        assert_eq!(outliers(&[1.0, 9.0]), [false, false]);
        // Ten equal values and another one.
        assert_eq!(outliers(&[1.0, 1.0, 1.0, 1.0, 1.1]), [false, false, false, false, true]);
    }

    const CHI_SQUARED: [(f64, usize, f64); 7] = [
        (0.025, 1, 5.023_886_187_314_889),
        (0.975, 1, 0.000_982_069_117_175_256),
        (0.025, 4, 11.143_286_781_877_798),
        (0.975, 4, 0.484_418_557_087_929_8),
        (0.025, 40, 59.341_707_143_171_2),
        (0.975, 41, 25.214_518_638_112_51),
        (0.5, 1000, 999.333_412_403_381),
    ];

    const NORMAL: [(f64, f64, f64); 7] = [
        (-60.0, -1_805.013_560_680_567, 60.016_657_420_241_124),
        (-36.0, -652.503_227_593_798_4, 36.027_735_075_281_06),
        (-34.0, -582.446_162_246_871_7, 34.029_361_097_995_02),
        (-3.0, -6.607_726_221_510_349, 3.283_098_654_930_436_4),
        (0.0, -std::f64::consts::LN_2, 0.797_884_560_802_865_4),
        (2.0, -0.023_012_909_328_963_486, 0.055_247_862_678_989_956),
        (9.0, -1.128_588_405_953_840_5e-19, 1.027_977_357_166_891_5e-18),
    ];

    const SAMPLE: [f64; 6] = [
        1.006,
        0.092_357_999_112_150_54,
        0.891_322_397_556_307_4,
        1.120_677_602_443_692_6,
        0.055_334_737_932_210_94,
        0.265_395_848_700_911_4,
    ];
}
