//! Least squares of `f0 + C h^p + D h^q`: the fit behind every order and limit that values themselves give.
//!
//! For given powers the coefficients follow linearly, so only p is searched for, in ±[`ORDER_MAX`].

use super::grid_convergence::range;
use super::order::{bisect, student_t};

/// A value at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridValue {
    /// Step h, positive.
    pub step: f64,
    /// Value f(h).
    pub value: f64,
    /// Half-width of the rounding of `value`: of the last digit printed, or of the arithmetic. Not negative.
    pub round_off: f64,
}

impl GridValue {
    /// A value that is only rounded to `f64`.
    pub fn new(step: f64, value: f64) -> Self {
        Self { step, value, round_off: 0.5 * f64::EPSILON * value.abs() }
    }
}

/// Orders beyond this size are not searched for.
pub(super) const ORDER_MAX: f64 = 10.0;

/// Share of the second term that the first has at least at the finest step.
const LEADING_SHARE: f64 = 0.02;

/// How the deviations of a fit are weighed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Weights {
    Equal,
    InverseStep,
    /// Deviations proportional to h^p.
    Power(f64),
}

/// The powers of h in a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Terms {
    /// `f0 + C h^p`.
    One(f64),
    /// `f0 + C h^p + D h^q`.
    Two(f64, f64),
}

/// One least-squares solution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) order: f64,
    pub(super) limit: f64,
    /// C, for the step in its own unit.
    pub(super) constant: f64,
    /// D, as C.
    pub(super) second: f64,
    pub(super) at_finest: f64,
    /// Weighted sum of squares over the square of the scale, weights of mean one.
    pub(super) sum: f64,
    pub(super) likelihood: f64,
    /// Variance of the limit over that of a deviation.
    spread: f64,
    pub(super) weights: Weights,
}

/// Values over their steps, ascending, ready for fitting: differences from the finest value, logarithms about their mean.
pub(super) struct Samples<'a> {
    pub(super) table: &'a [GridValue],
    /// Differences from the origin over `scale`: sums of their squares are numbers whatever the unit.
    values: Vec<f64>,
    origin: f64,
    /// Largest of those differences.
    pub(super) scale: f64,
    logs: Vec<f64>,
    log_mean: f64,
    rounding_share: f64,
    /// Limit, where it is known.
    known: Option<f64>,
}

/// Products of the columns of a fit, weighted.
fn dot(a: &[f64], b: &[f64], w: &[f64]) -> f64 {
    a.iter().zip(b).zip(w).map(|((a, b), w)| a * b * w).sum()
}

impl<'a> Samples<'a> {
    pub(super) fn new(table: &'a [GridValue], known: Option<f64>) -> Self {
        let log_mean = table.iter().map(|grid| grid.step.ln()).sum::<f64>() / table.len() as f64;
        let origin = known.unwrap_or(table[0].value);
        let largest = table.iter().map(|grid| (grid.value - origin).abs()).fold(0.0, f64::max);
        let scale = if largest > 0.0 { largest } else { 1.0 };
        let dof = table.len().saturating_sub(if known.is_some() { 2 } else { 3 }).max(1);
        Self {
            table,
            values: table.iter().map(|grid| (grid.value - origin) / scale).collect(),
            origin,
            scale,
            logs: table.iter().map(|grid| grid.step.ln() - log_mean).collect(),
            log_mean,
            rounding_share: 2.0 / 3.0_f64.sqrt() / student_t(0.05, dof),
            known,
        }
    }

    fn weights(&self, weights: Weights) -> Vec<f64> {
        match weights {
            Weights::Equal => vec![1.0; self.logs.len()],
            Weights::InverseStep => self.logs.iter().map(|log| (-log).exp()).collect(),
            Weights::Power(p) => self.logs.iter().map(|log| (-2.0 * p * log).exp()).collect(),
        }
    }

    /// The fit for given powers; `None` where the columns cannot be distinguished.
    ///
    /// The basis is `(h^p - 1)/p` about the geometric mean step and not `h^p`: it passes through `ln h` at p = 0 where
    /// `h^p` and the constant become one. With a known limit it is `h^p`.
    pub(super) fn fit(&self, terms: Terms, weights: Weights) -> Option<Fit> {
        let (order, other) = match terms {
            Terms::One(p) => (p, None),
            Terms::Two(p, q) => (p, Some(q)),
        };
        let w = self.weights(weights);
        let n = w.len() as f64;
        let total: f64 = w.iter().sum();
        let free = self.known.is_none();
        let basis = |p: f64| -> Vec<f64> {
            let at = |log: f64| match (free, p == 0.0) {
                (true, true) => log,
                (true, false) => (p * log).exp_m1() / p,
                (false, _) => (p * log).exp(),
            };
            self.logs.iter().map(|&log| at(log)).collect()
        };
        // Value of a column at h = 0.
        let at_zero = |p: f64| if free { -1.0 / p } else { 0.0 };
        let centre = |column: &mut Vec<f64>| {
            let mean = if free { column.iter().zip(&w).map(|(c, w)| c * w).sum::<f64>() / total } else { 0.0 };
            for c in column.iter_mut() {
                *c -= mean;
            }
            mean
        };
        let mut values = self.values.clone();
        let value_mean = centre(&mut values);
        let mut first = basis(order);
        let first_zero = at_zero(order) - centre(&mut first);
        let first_square = dot(&first, &first, &w);
        if first_square <= 0.0 || !first_square.is_finite() {
            return None;
        }
        let mut slope = dot(&first, &values, &w) / first_square;
        let mut deviations: Vec<f64> = values.iter().zip(&first).map(|(v, b)| v - slope * b).collect();
        let mut limit = value_mean + slope * first_zero;
        let mut spread = if free { 1.0 / total } else { 0.0 } + first_zero * first_zero / first_square;
        let mut second_slope = 0.0;
        if let Some(q) = other {
            let mut second = basis(q);
            let mut second_zero = at_zero(q) - centre(&mut second);
            let before = dot(&second, &second, &w);
            let share = dot(&second, &first, &w) / first_square;
            second.iter_mut().zip(&first).for_each(|(s, f)| *s -= share * f);
            second_zero -= share * first_zero;
            let square = dot(&second, &second, &w);
            if square.is_nan() || square <= 1e-20 * before {
                return None;
            }
            second_slope = dot(&second, &deviations, &w) / square;
            deviations.iter_mut().zip(&second).for_each(|(d, s)| *d -= second_slope * s);
            limit += second_slope * second_zero;
            spread += second_zero * second_zero / square;
            slope -= second_slope * share;
        }
        let (mut sum, mut floor) = (0.0, 0.0);
        for (i, w) in w.iter().enumerate() {
            sum += w * deviations[i] * deviations[i];
            floor += w * self.rounding(i).powi(2);
        }
        // The logs have mean zero, so the determinant of these weights is one, except that of 1/h which is not compared.
        let likelihood = -0.5 * n * ((sum + floor).max(f64::MIN_POSITIVE) / n).ln();
        let unit = |slope: f64, p: f64| if free { slope / p } else { slope } * (-p * self.log_mean).exp() * self.scale;
        Some(Fit {
            order,
            limit: self.known.unwrap_or(self.origin + limit * self.scale),
            constant: unit(slope, order),
            second: other.map_or(0.0, |q| unit(second_slope, q)),
            at_finest: self.origin + (self.values[0] - deviations[0]) * self.scale,
            sum: sum * n / total,
            likelihood,
            spread,
            weights,
        })
    }

    /// The better of the two weightings of a law, by likelihood. A first term that is not seen beside the second at the
    /// finest step is none: with the coefficient zero any power fits.
    fn likely(&self, terms: Terms) -> Option<Fit> {
        let (Terms::One(p) | Terms::Two(p, _)) = terms;
        let (equal, power) = (self.fit(terms, Weights::Equal)?, self.fit(terms, Weights::Power(p))?);
        let best = if equal.likelihood >= power.likelihood { equal } else { power };
        // By what they change there: at p = 0 the first is a constant, whatever its coefficient.
        let at_finest = |constant: f64, power: f64| (constant * power * self.table[0].step.powf(power)).abs();
        match terms {
            Terms::Two(p, q) if at_finest(best.constant, p) < LEADING_SHARE * at_finest(best.second, q) => None,
            _ => Some(best),
        }
    }

    /// The best of a scan over the orders, refined between its neighbours.
    pub(super) fn search(fit: impl Fn(f64) -> Option<Fit>, worse: impl Fn(&Fit, &Fit) -> bool) -> Option<Fit> {
        let grid = |i: usize| ORDER_MAX * (i as f64 / 100.0 - 1.0) + 1e-9;
        let better = |best: Option<Fit>, next: Option<Fit>| match (best, next) {
            (Some(best), Some(next)) => Some(if worse(&best, &next) { next } else { best }),
            (best, next) => best.or(next),
        };
        let best = (0..=200).map(|i| fit(grid(i))).fold(None, &better)?;
        let (mut low, mut high) = (best.order - 0.1, best.order + 0.1);
        let golden = 0.618_033_988_749_894_9;
        for _ in 0..60 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            let (Some(at_a), Some(at_b)) = (fit(a), fit(b)) else { break };
            (low, high) = if worse(&at_a, &at_b) { (a, high) } else { (low, b) };
        }
        better(Some(best), fit(0.5 * (low + high)))
    }

    /// Standard deviations of the three finest values about `fit`.
    pub(super) fn deviations(&self, fit: &Fit, dof: usize) -> [f64; 3] {
        let w = self.weights(fit.weights);
        let mean = w.iter().sum::<f64>() / w.len() as f64;
        [0, 1, 2].map(|i| w.get(i).map_or(0.0, |w| (fit.sum / dof as f64 * mean / w).sqrt() * self.scale))
    }

    /// Standard deviation of the rounding of row `i`, 1/sqrt(3) of its half-width, as it enters the likelihood.
    ///
    /// The rounding error is known, so Student's t, which is large for few rows, must not inflate it. Scaled by 2/t, it
    /// contributes two standard deviations to the 95 % interval.
    pub(super) fn rounding(&self, i: usize) -> f64 {
        self.table[i].round_off / self.scale * self.rounding_share
    }
}

/// A law whose leading power is free.
pub(super) struct Model<'a> {
    pub(super) samples: &'a Samples<'a>,
    /// The second power over the first, `q - p`; none for one term.
    pub(super) next: Option<f64>,
    pub(super) best: Fit,
    pub(super) dof: usize,
}

impl<'a> Model<'a> {
    pub(super) fn new(samples: &'a Samples<'a>, next: Option<f64>) -> Option<Self> {
        let parameters = 2 + usize::from(samples.known.is_none()) + usize::from(next.is_some());
        let dof = samples.table.len().checked_sub(parameters).filter(|dof| *dof > 0)?;
        let best = Samples::search(|p| samples.likely(terms(p, next)), |a, b| b.likelihood > a.likelihood)?;
        Some(Self { samples, next, best, dof })
    }

    /// Standard deviation of the values about the law, over their range.
    pub(super) fn scatter(&self) -> f64 {
        (self.best.sum / self.dof as f64).sqrt() * self.samples.scale / range(self.samples.table)
    }

    pub(super) fn at(&self, p: f64) -> Option<Fit> {
        self.samples.likely(terms(p, self.next))
    }

    /// How far the likelihood may fall below the best inside the interval of a level: `n/2 ln(1 + t²/dof)`.
    pub(super) fn drop_at(&self, level: f64) -> f64 {
        let t = student_t(level, self.dof);
        0.5 * self.samples.table.len() as f64 * (t * t / self.dof as f64).ln_1p()
    }

    /// The outermost orders that the level does not reject.
    pub(super) fn orders(&self, level: f64) -> [f64; 2] {
        let drop = self.drop_at(level);
        let best = &self.best;
        [-1.0, 1.0].map(|side| {
            let inside = |p: f64| self.at(p).is_some_and(|fit| fit.likelihood >= best.likelihood - drop);
            let steps = ((ORDER_MAX - side * best.order) / 0.1).max(0.0) as usize;
            // From outside in, so that an interval of several pieces is covered whole.
            let place = |i: usize| best.order + side * 0.1 * i as f64;
            let Some(last) = (1..=steps).rev().find(|&i| inside(place(i))) else {
                return bisect(best.order, place(1), 50, inside);
            };
            if last == steps { side * ORDER_MAX } else { bisect(place(last), place(last + 1), 50, inside) }
        })
    }

    /// The limits that belong to the orders of `band`, each with its own error at the level.
    pub(super) fn limits(&self, band: [f64; 2], level: f64) -> [f64; 2] {
        let (n, drop) = (self.samples.table.len() as f64, self.drop_at(level));
        let best = &self.best;
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        for i in 0..=40 {
            let p = band[0] + (band[1] - band[0]) * f64::from(i) / 40.0;
            // A band that touches zero has limits without bound.
            if p <= 1e-3 {
                return [f64::NEG_INFINITY, f64::INFINITY];
            }
            let Some(fit) = self.at(p) else { continue };
            let variance = (-2.0 * fit.likelihood / n).exp() * fit.spread;
            let spare = (drop - (best.likelihood - fit.likelihood)).max(0.0);
            let half = (variance * n * (2.0 * spare / n).exp_m1()).sqrt() * self.samples.scale;
            reach = [reach[0].min(fit.limit - half), reach[1].max(fit.limit + half)];
        }
        reach
    }
}

fn terms(p: f64, next: Option<f64>) -> Terms {
    next.map_or(Terms::One(p), |next| Terms::Two(p, p + next))
}
