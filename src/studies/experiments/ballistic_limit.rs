//! Which ballistic limit do residual velocities and outcomes of tests show?
//!
//! ```text
//! V_r = a (V^p - V_bl^p)^(1/p)          Lambert and Jonas (1976); p = 2 is Recht and Ipson (1963)
//! P(perforated at V) = Φ((V - V50)/σ)   probit; V50 and σ of greatest likelihood
//! ```
//!
//! For given p and V_bl the best a follows linearly, so least squares is one root for V_bl within one for p (argmin). Intervals are
//! `± t s √(JᵀJ)⁻¹` of the linearised model. The interval of V50 holds every V50 that the likelihood ratio does not reject at 95 %.
//! Where no stop is faster than a perforation, σ has no estimate, and all that is known of V50 lies between the fastest stop and the
//! slowest perforation.
//!
//! Sources: R. F. Recht, T. W. Ipson, J. Appl. Mech. 30 (1963) 384; J. P. Lambert, G. H. Jonas, BRL-R-1852 (1976).

use argmin::core::{CostFunction, Executor};
use argmin::solver::brent::BrentRoot;
use nalgebra::{DMatrix, Matrix3};
use serde::Serialize;

use super::statistics::{CHI_SQUARED_95, LEVEL, ln_normal};
use crate::studies::order::student_t;

/// Places at which a range is looked through before a root is bracketed.
const SCAN: usize = 200;

/// Shots through which a range is looked at most; of more, neighbours are taken together there, and all of them have the last word.
const LOOKED_THROUGH: usize = 500;

/// Places by which the turns of few and of all shots may lie apart.
const APART: usize = 2;

/// Powers p that are searched.
const POWERS: [f64; 2] = [1.0, 10.0];

/// A number with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// 95 % interval.
    pub interval95: [f64; 2],
}

/// A curve through residual velocities.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct ResidualFit {
    /// Residual velocities above zero.
    pub shots: usize,
    /// Factor a.
    pub a: Estimate,
    /// Power p; without an interval where it is 2 by assumption.
    pub p: f64,
    /// 95 % interval of p.
    pub p95: Option<[f64; 2]>,
    /// Ballistic limit `V_bl` (m/s).
    pub limit_m_s: Estimate,
    /// Standard deviation of the residual velocities about the curve (m/s).
    pub deviation_m_s: f64,
}

impl ResidualFit {
    /// Residual velocity (m/s) at the impact velocity `speed` (m/s).
    pub fn at(&self, speed: f64) -> f64 {
        if speed <= self.limit_m_s.value { 0.0 } else { self.a.value * curve(speed, self.limit_m_s.value, self.p) }
    }
}

/// Ballistic limit by outcomes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct OutcomeFit {
    /// Perforations.
    pub perforated: usize,
    /// Stops.
    pub stopped: usize,
    /// Fastest stop (m/s).
    pub fastest_stop_m_s: f64,
    /// Slowest perforation (m/s).
    pub slowest_perforation_m_s: f64,
    /// Velocity (m/s) at which half the shots perforate; without mixed results, the middle between fastest stop and slowest
    /// perforation.
    pub v50_m_s: f64,
    /// 95 % interval, `null` where the shots set no bound; without mixed results, the two velocities themselves.
    pub v50_95_m_s: [Option<f64>; 2],
    /// σ (m/s); `null` without mixed results.
    pub deviation_m_s: Option<f64>,
}

/// `(v^p - b^p)^(1/p)` for `0 <= b < v`, without powers that overflow.
fn curve(v: f64, b: f64, p: f64) -> f64 {
    v * ((-(p * (b / v).ln()).exp()).ln_1p() / p).exp()
}

/// The root of `f` between `from` and `to`, where its signs differ.
fn root(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Option<f64> {
    struct Root<F>(F);
    impl<F: Fn(f64) -> f64> CostFunction for Root<F> {
        type Param = f64;
        type Output = f64;
        fn cost(&self, param: &f64) -> Result<f64, argmin::core::Error> {
            Ok(self.0(*param))
        }
    }
    let solver = BrentRoot::new(from, to, 1e-16 * (from.abs() + to.abs()));
    let run = Executor::new(Root(f), solver).configure(|state| state.param(0.5 * (from + to)).max_iters(200)).run();
    run.ok()?.state.best_param.filter(|root| root.is_finite())
}

/// A function of one number to be made least, and its derivative.
struct Objective<V, S> {
    value: V,
    slope: S,
}

/// The least minimum between `from` and `to`, and not at an end.
///
/// `coarse` is near `fine` and cheaper: it is looked through for the places where its slope turns, and there `fine` has its root.
fn minimum(
    [from, to]: [f64; 2],
    coarse: impl Fn(f64) -> f64,
    fine: &Objective<impl Fn(f64) -> f64, impl Fn(f64) -> f64>,
) -> Option<f64> {
    let place = |index: usize| from + (to - from) * index as f64 / SCAN as f64;
    let turns = |slopes: &[f64]| -> Vec<usize> {
        (0..slopes.len() - 1).filter(|&index| slopes[index] < 0.0 && slopes[index + 1] >= 0.0).collect()
    };
    let looked: Vec<f64> = (0..=SCAN).map(|index| coarse(place(index))).collect();
    // The two turn at most a few places apart.
    let near = |index: usize| {
        let (first, last) = (index.saturating_sub(APART), (index + 1 + APART).min(SCAN));
        let slopes: Vec<f64> = (first..=last).map(|index| (fine.slope)(place(index))).collect();
        turns(&slopes).into_iter().map(move |turn| first + turn)
    };
    let turns: std::collections::BTreeSet<usize> = turns(&looked).into_iter().flat_map(near).collect();
    let minima = turns.into_iter().filter_map(|index| root(place(index), place(index + 1), &fine.slope));
    minima.min_by(|a, b| (fine.value)(*a).total_cmp(&(fine.value)(*b)))
}

/// Residual velocities over impact velocities, both over the greatest impact velocity, and how many shots each stands for.
struct Residuals(Vec<(f64, f64, f64)>);

/// The curve of given p and limit that fits best.
struct Best {
    a: f64,
    squares: f64,
}

impl Residuals {
    fn best(&self, b: f64, p: f64) -> Best {
        let [rg, gg] = self.0.iter().fold([0.0; 2], |[rg, gg], &(v, r, count)| {
            let g = curve(v, b, p);
            [rg + count * r * g, gg + count * g * g]
        });
        let a = rg / gg;
        Best { a, squares: self.0.iter().map(|&(v, r, count)| count * (r - a * curve(v, b, p)).powi(2)).sum() }
    }

    /// `curve`, and its dg/db and dg/dp, of one power and two logarithms.
    fn slopes(v: f64, b: f64, p: f64) -> [f64; 3] {
        let ln_ratio = (b / v).ln();
        let q = (p * ln_ratio).exp();
        let ln_rest = (-q).ln_1p() / p;
        let g = v * ln_rest.exp();
        // Without a limit its logarithm is none.
        if q == 0.0 {
            return [g, -(b / g).powf(p - 1.0), 0.0];
        }
        let by_power = -ln_rest - q * ln_ratio / (1.0 - q);
        [g, -((p - 1.0) * (ln_ratio - ln_rest)).exp(), g * by_power / p]
    }

    /// Half the derivative of the sum of squares over a: that by the limit, and by p.
    fn gradient(&self, b: f64, p: f64) -> [f64; 2] {
        let [rg, gg, rb, gb, rp, gp] = self.0.iter().fold([0.0; 6], |sum, &(v, r, count)| {
            let [g, by_limit, by_power] = Self::slopes(v, b, p);
            let term = [r * g, g * g, r * by_limit, g * by_limit, r * by_power, g * by_power];
            std::array::from_fn(|index| sum[index] + count * term[index])
        });
        let a = rg / gg;
        [a * gb - rb, a * gp - rp]
    }

    /// The best limit of given p, looked for by the curve through `coarse`; `None` where it is zero.
    fn limit(&self, coarse: &Self, p: f64) -> Option<f64> {
        let slowest = self.0.iter().map(|(v, ..)| *v).fold(f64::INFINITY, f64::min);
        let fine = Objective { value: |b| self.best(b, p).squares, slope: |b| self.gradient(b, p)[0] };
        // At the slowest shot itself the slope is infinite.
        minimum([0.0, slowest * (1.0 - 1e-9)], |b| coarse.gradient(b, p)[0], &fine)
    }

    /// The best limit and p that is free.
    fn free(&self, coarse: &Self) -> Option<(f64, f64)> {
        // Where no limit fits there is no minimum either.
        let slope_of = |shots: &Self, p| shots.limit(coarse, p).map_or(-1.0, |b| shots.gradient(b, p)[1]);
        let value = |p| self.limit(coarse, p).map_or(f64::INFINITY, |b| self.best(b, p).squares);
        let fine = Objective { value, slope: |p| slope_of(self, p) };
        let p = minimum(POWERS, |p| slope_of(coarse, p), &fine)?;
        Some((self.limit(coarse, p)?, p))
    }

    /// Neighbours in the impact velocity taken together, [`LOOKED_THROUGH`] at most. The slowest stay alone: near them the curve is
    /// steep, and at the slowest of all ends the range of the limit.
    fn coarse(&self) -> Self {
        let mut shots = self.0.clone();
        shots.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = |shots: &[(f64, f64, f64)]| {
            let count = shots.len() as f64;
            let of = |number: fn(&(f64, f64, f64)) -> f64| shots.iter().map(number).sum::<f64>() / count;
            (of(|shot| shot.0), of(|shot| shot.1), count)
        };
        let alone = LOOKED_THROUGH / 2;
        let (slowest, others) = shots.split_at(shots.len().min(alone));
        let together = others.chunks(others.len().div_ceil(alone).max(1)).map(mean);
        Self(slowest.iter().copied().chain(together).collect())
    }

    /// The curve of `b` and `p` with its intervals; velocities times `unit`.
    fn fit(&self, b: f64, p: f64, is_free: bool, unit: f64) -> Option<ResidualFit> {
        let Best { a, squares } = self.best(b, p);
        let parameters = if is_free { 3 } else { 2 };
        let dof = self.0.len().checked_sub(parameters).filter(|dof| *dof > 0)?;
        let rows = DMatrix::from_fn(self.0.len(), 3, |row, column| {
            let [g, by_limit, by_power] = Self::slopes(self.0[row].0, b, p);
            [g, a * by_limit, if is_free { a * by_power } else { 0.0 }][column]
        });
        let mut normal = Matrix3::from_fn(|i, j| rows.column(i).dot(&rows.column(j)));
        if !is_free {
            normal[(2, 2)] = 1.0;
        }
        let inverse = normal.try_inverse()?;
        let deviation = (squares / dof as f64).sqrt();
        let half = |index: usize| student_t(LEVEL, dof) * deviation * inverse[(index, index)].sqrt();
        let around = |value: f64, half: f64| [value - half, value + half];
        Some(ResidualFit {
            shots: self.0.len(),
            a: Estimate { value: a, interval95: around(a, half(0)) },
            p,
            p95: is_free.then(|| around(p, half(2))),
            limit_m_s: Estimate { value: b * unit, interval95: around(b, half(1)).map(|end| end * unit) },
            deviation_m_s: deviation * unit,
        })
    }
}

/// The curve through `residuals`, impact and residual velocities (m/s) of which those above zero count, with p = 2 (Recht and
/// Ipson) and with p free (Lambert and Jonas).
///
/// `None` for fewer than three different impact velocities, or four with p free, for those whose best limit is zero, and for a p at an end of 1 to 10.
pub fn of_residuals(residuals: &[(f64, f64)]) -> [Option<ResidualFit>; 2] {
    let perforated = residuals.iter().filter(|(_, residual)| *residual > 0.0);
    let unit = perforated.clone().map(|(speed, _)| *speed).fold(0.0, f64::max);
    let scaled = Residuals(perforated.map(|(speed, residual)| (speed / unit, residual / unit, 1.0)).collect());
    // Shots of equal velocity say no more of the curve than one.
    let distinct = scaled.0.iter().map(|(v, ..)| v.to_bits()).collect::<std::collections::BTreeSet<_>>().len();
    if distinct < 3 {
        return [None; 2];
    }
    let coarse = scaled.coarse();
    let plain = scaled.limit(&coarse, 2.0).and_then(|b| scaled.fit(b, 2.0, false, unit));
    let free = || scaled.free(&coarse).and_then(|(b, p)| scaled.fit(b, p, true, unit));
    [plain, if distinct > 3 { free() } else { None }]
}

/// Impact velocities, from their mean in units of their greatest distance from it, and how many perforated and stopped at each.
struct Outcomes(Vec<(f64, [f64; 2])>);

impl Outcomes {
    /// Logarithm of the likelihood of V50 = `middle` and 1/σ = `steepness`, and its derivatives by both.
    fn likelihood(&self, middle: f64, steepness: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(v, counts) in &self.0 {
            for (sign, count) in [1.0, -1.0].into_iter().zip(counts).filter(|(_, count)| *count > 0.0) {
                let (ln, slope) = ln_normal(sign * steepness * (v - middle));
                sum[0] += count * ln;
                sum[1] -= count * sign * steepness * slope;
                sum[2] += count * sign * (v - middle) * slope;
            }
        }
        sum
    }

    /// Neighbours in the impact velocity taken together, [`LOOKED_THROUGH`] at most.
    fn coarse(&self) -> Self {
        let mut shots = self.0.clone();
        shots.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = |shots: &[(f64, [f64; 2])]| {
            let velocity = shots.iter().map(|shot| shot.0).sum::<f64>() / shots.len() as f64;
            (velocity, [0, 1].map(|index| shots.iter().map(|shot| shot.1[index]).sum()))
        };
        Self(shots.chunks(shots.len().div_ceil(LOOKED_THROUGH).max(1)).map(mean).collect())
    }

    /// The best 1/σ for given V50: the likelihood is concave in it. `None` where none is best, for a `middle` that parts the outcomes.
    fn steepness(&self, middle: f64) -> Option<f64> {
        let slope = |steepness: f64| self.likelihood(middle, steepness)[2];
        if slope(0.0) <= 0.0 {
            return Some(0.0);
        }
        let mut steep = 1.0;
        // To 1e9 times the width of the velocities.
        for _ in 0..30 {
            if slope(steep) < 0.0 {
                return root(0.0, steep, slope);
            }
            steep *= 2.0;
        }
        None
    }

    /// The likelihood of `middle` with the best 1/σ; nothing is more likely than what parts the outcomes.
    fn profile(&self, middle: f64) -> f64 {
        self.steepness(middle).map_or(0.0, |steepness| self.likelihood(middle, steepness)[0])
    }
}

/// The ballistic limit of `outcomes`, impact velocities (m/s) with whether they perforated; `None` without both outcomes, and where
/// perforations are no faster than stops on the whole.
pub fn of_outcomes(outcomes: &[(f64, bool)]) -> Option<OutcomeFit> {
    /// Widths of the velocities within which an interval ends, or it has no end.
    const FAR: f64 = 20.0;
    let speeds = |wanted: bool| outcomes.iter().filter(move |shot| shot.1 == wanted).map(|shot| shot.0);
    let (perforated, stopped) = (speeds(true).count(), speeds(false).count());
    if perforated == 0 || stopped == 0 {
        return None;
    }
    let (fastest_stop_m_s, slowest_perforation_m_s) =
        (speeds(false).fold(0.0, f64::max), speeds(true).fold(f64::INFINITY, f64::min));
    let found = |v50_m_s, v50_95_m_s, deviation_m_s| OutcomeFit {
        perforated,
        stopped,
        fastest_stop_m_s,
        slowest_perforation_m_s,
        v50_m_s,
        v50_95_m_s,
        deviation_m_s,
    };
    if fastest_stop_m_s <= slowest_perforation_m_s {
        let ends = [fastest_stop_m_s, slowest_perforation_m_s];
        return Some(found(0.5 * (ends[0] + ends[1]), ends.map(Some), None));
    }
    let center = outcomes.iter().map(|shot| shot.0).sum::<f64>() / outcomes.len() as f64;
    let unit = outcomes.iter().map(|shot| (shot.0 - center).abs()).fold(0.0, f64::max);
    let counts = |perforated: bool| if perforated { [1.0, 0.0] } else { [0.0, 1.0] };
    let scaled = Outcomes(outcomes.iter().map(|&(v, outcome)| ((v - center) / unit, counts(outcome))).collect());
    let slope = |of: &Outcomes, middle: f64| -of.steepness(middle).map_or(0.0, |s| of.likelihood(middle, s)[1]);
    let fine = Objective { value: |middle| -scaled.profile(middle), slope: |middle| slope(&scaled, middle) };
    let coarse = scaled.coarse();
    let middle = minimum([-1.0, 1.0], |middle| slope(&coarse, middle), &fine)?;
    let steepness = scaled.steepness(middle).filter(|steepness| *steepness > 0.0)?;
    let most = scaled.profile(middle);
    let beyond = |at: f64| most - scaled.profile(at) - 0.5 * CHI_SQUARED_95;
    let end = |side: f64| {
        let step = |index: usize| middle + side * FAR * (index as f64 / SCAN as f64).powi(2);
        let outside = (1..=SCAN).find(|&index| beyond(step(index)) > 0.0)?;
        Some(center + unit * root(step(outside - 1), step(outside), beyond)?)
    };
    Some(found(center + unit * middle, [end(-1.0), end(1.0)], Some(unit / steepness)))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const RESIDUALS: [(f64, f64); 7] =
        [(420.0, 110.0), (450.0, 190.0), (500.0, 275.0), (560.0, 362.0), (640.0, 461.0), (720.0, 555.0), (390.0, 0.0)];

    const OUTCOMES: [(f64, bool); 10] = [
        (300.0, false),
        (320.0, false),
        (335.0, true),
        (340.0, false),
        (350.0, false),
        (355.0, true),
        (360.0, false),
        (370.0, true),
        (385.0, true),
        (400.0, true),
    ];

    /// mpmath, 40 digits: `findroot` of the gradient of the sum of squares, J by `diff`, Student's t by `betainc`. The order is a, `V_bl`,
    /// p, the half widths of their intervals, and the deviation.
    #[test]
    fn curves_through_residual_velocities_are_those_of_least_squares_in_forty_digits() {
        let [plain, free] = of_residuals(&RESIDUALS);
        for (fit, expected) in [
            (
                plain.unwrap(),
                [
                    0.928_991_779_359_873_5,
                    402.498_771_093_406_33,
                    2.0,
                    0.006_638_447_927_460_631,
                    1.542_846_959_298_499,
                    0.0,
                    1.845_668_141_872_349,
                ],
            ),
            (
                free.unwrap(),
                [
                    0.922_059_161_186_619_2,
                    403.432_280_405_650_03,
                    2.032_479_539_244_376_6,
                    0.028_467_897_006_803_74,
                    4.046_151_633_439_779,
                    0.130_382_479_624_932_8,
                    1.942_035_282_193_233_4,
                ],
            ),
        ] {
            let half = |[low, high]: [f64; 2]| 0.5 * (high - low);
            let found = [
                fit.a.value,
                fit.limit_m_s.value,
                fit.p,
                half(fit.a.interval95),
                half(fit.limit_m_s.interval95),
                fit.p95.map_or(0.0, half),
                fit.deviation_m_s,
            ];
            assert_eq!(fit.shots, 6);
            for (found, expected) in found.into_iter().zip(expected) {
                assert_relative_eq!(found, expected, max_relative = 1e-12);
            }
            assert_eq!(fit.at(fit.limit_m_s.value), 0.0);
        }
    }

    /// The same fits by all shots at every place, which took minutes for tens of thousands.
    #[test]
    fn thousands_of_shots_have_the_curve_and_the_limit_that_all_of_them_show() {
        let mut random = crate::studies::random::Random::for_part(5, "ballistic limit");
        let mut speed = || random.log_uniform(250.0, 800.0);
        // Limits that scatter, so that some shots are slower than the limit of the others.
        let limit = |index: usize| 400.0 * (1.0 + 0.05 * (index as f64 * 0.7).sin());
        let shots: Vec<(f64, f64)> = (0..3000).map(|index| (speed(), limit(index))).collect();
        let residuals: Vec<(f64, f64)> =
            shots.iter().filter(|(v, b)| v > b).map(|(v, b)| (*v, (v * v - b * b).sqrt())).collect();
        let unit = residuals.iter().map(|(speed, _)| *speed).fold(0.0, f64::max);
        let scaled = Residuals(residuals.iter().map(|(v, r)| (v / unit, r / unit, 1.0)).collect());
        assert!(scaled.coarse().0.len() <= LOOKED_THROUGH && scaled.0.len() > 2 * LOOKED_THROUGH);
        let [plain, free] = of_residuals(&residuals).map(Option::unwrap);
        assert_eq!(plain.limit_m_s.value, unit * scaled.limit(&scaled, 2.0).unwrap());
        let (b, p) = (free.limit_m_s.value / unit, free.p);
        // No place far and near has less squares.
        let least = scaled.best(b, p).squares;
        for power in [1.0, 1.2, 1.5, p - 0.01, p + 0.01, 2.0, 3.0, 6.0] {
            let other = scaled.limit(&scaled, power).map_or(f64::INFINITY, |b| scaled.best(b, power).squares);
            assert!(other >= least, "{power}: {other} {least}");
        }
        let outcomes: Vec<(f64, bool)> = shots.iter().map(|(v, b)| (*v, v > b)).collect();
        let fit = of_outcomes(&outcomes).unwrap();
        // Twice the same shots: the same limit, and bars less by the root of two.
        let twice = of_outcomes(&[&outcomes[..], &outcomes[..]].concat()).unwrap();
        assert_relative_eq!(fit.v50_m_s, twice.v50_m_s, max_relative = 1e-9);
        let [width, half] = [&fit, &twice].map(|fit| fit.v50_95_m_s[1].unwrap() - fit.v50_95_m_s[0].unwrap());
        assert_relative_eq!(width / half, std::f64::consts::SQRT_2, max_relative = 1e-2);
    }

    #[test]
    fn residual_velocities_that_show_no_limit_have_no_curve() {
        assert_eq!(of_residuals(&RESIDUALS[..2]), [None; 2]);
        assert_eq!(of_residuals(&[(400.0, 400.0), (500.0, 500.0), (600.0, 600.0), (700.0, 700.0)]), [None; 2]);
        assert_eq!(of_residuals(&[(400.0, 50.0); 5]), [None; 2]);
        assert_eq!(of_residuals(&[(400.0, 200.0); 4]), [None; 2]);
        // Faster out than in.
        assert!(of_residuals(&[(400.0, 900.0), (500.0, 700.0), (600.0, 800.0), (700.0, 600.0)])[0].is_none());
    }

    /// mpmath, 40 digits: `findroot` of the gradient of the likelihood, and bisection of its profile for the interval.
    #[test]
    fn v50_of_mixed_outcomes_is_that_of_greatest_likelihood_in_forty_digits() {
        let fit = of_outcomes(&OUTCOMES).unwrap();
        assert_relative_eq!(fit.v50_m_s, 351.237_302_852_528_7, max_relative = 1e-12);
        assert_relative_eq!(fit.deviation_m_s.unwrap(), 22.985_789_832_471_07, max_relative = 1e-12);
        assert_relative_eq!(fit.v50_95_m_s[0].unwrap(), 303.221_277_356_335_1, max_relative = 1e-12);
        assert_relative_eq!(fit.v50_95_m_s[1].unwrap(), 399.715_380_739_124_27, max_relative = 1e-12);
        assert_eq!((fit.perforated, fit.stopped), (5, 5));
    }

    #[test]
    fn outcomes_without_a_mixed_zone_bound_the_limit_and_estimate_no_deviation() {
        let fit = of_outcomes(&[(300.0, false), (320.0, false), (330.0, true), (400.0, true)]).unwrap();
        assert_eq!((fit.v50_m_s, fit.v50_95_m_s, fit.deviation_m_s), (325.0, [Some(320.0), Some(330.0)], None));
        assert_eq!(of_outcomes(&[(300.0, true), (310.0, true)]), None);
        // The slow ones perforate.
        assert_eq!(of_outcomes(&[(300.0, true), (310.0, true), (320.0, false), (330.0, false)]), None);
        // Two of each: nothing bounds the limit at 95 %.
        let few = of_outcomes(&[(300.0, false), (330.0, true), (340.0, false), (400.0, true)]).unwrap();
        assert!(few.deviation_m_s.is_some() && few.v50_95_m_s.contains(&None), "{few:?}");
    }
}
