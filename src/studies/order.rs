//! At which power of the step does an error vanish, and how sure is that?
//!
//! ```text
//! |e(h)| = C h^p U,   ln|e| = ln C + p ln h + ln U
//! ```
//!
//! The order p and the constant C come from least squares over many step sizes with random ratios. Pairwise orders
//! are noise here: x = k d, x = H and rest fall at a random place in the step, so U is random, and often close to
//! zero. Hence the interval beside every order, and a verdict that rests on a wider band ([`FALSE_ALARM_LEVEL`]).
//!
//! Before the fit, and each with its reason kept at the point ([`Exclusion`]):
//! - errors that are zero are left out, for they have no logarithm;
//! - the finest steps are left out when the error stops falling there **and** lies within [`ROUND_OFF_ALLOWANCE`]
//!   times the round-off. An error that levels off anywhere above is no floor: the method converges to something else;
//! - the coarsest steps are left out when the finer ones follow another power, by the test of [`BEND_LEVEL`]. The order
//!   is a limit for h -> 0, so the fine end decides, also when it is the worse one.
//!
//! The same fit serves error against tolerance (slope 1: proportional) and error against 1/evaluations (slope: order).
//!
//! Source of the statistics: Draper and Smith, Applied Regression Analysis, ch. 1; Student t by Abramowitz and Stegun
//! 26.7.3 and 26.7.4.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use nalgebra::{DVector, Matrix3, Vector3};
use schemars::JsonSchema;
use serde::Serialize;
use thiserror::Error;

use crate::physics::Shown;

/// Two-sided level of the band behind a verdict: the chance that a right order falls outside.
///
/// A suite of 100 fits then raises a false alarm once in 10⁴ seeds. It holds for the noise that steps make and not
/// only for a normal one: `ln U` is skewed, but the steps lie evenly about their mean and the slope hardly feels it.
/// Over 10⁶ lines of 40 and of 60 points, `U` uniform or a sine, the bands of 10⁻² to 10⁻⁵ miss the order 0.1 to
/// 0.9 times as often as they say, and no right order failed in 8·10⁴ whole fits of 60 and 120 points. With 120 points
/// over three decades an order that is off by one half fails too (9999 of 10⁴ and more); with 60 nine in ten (`bands_keep_their_level_for_the_noise_of_steps` repeats a part of it).
pub const FALSE_ALARM_LEVEL: f64 = 1e-6;

/// Two-sided level at which a slope counts as different from zero, for the class.
pub const CLASS_LEVEL: f64 = 1e-3;

/// Half-width that no band goes below.
///
/// Without noise the residuals are the next term of the error, which is no random number: an interval made of them
/// does not cover the truth. Orders closer than this are not told apart.
pub const ORDER_RESOLUTION: f64 = 0.05;

/// Level of the F test for a bend in the line, before one is believed.
pub const BEND_LEVEL: f64 = 1e-10;

/// An error that stops falling is a round-off floor up to this many times the round-off of its point.
pub const ROUND_OFF_ALLOWANCE: f64 = 1e3;

/// Fewest different steps from which an order is fitted.
pub const STEPS_MIN: usize = 4;

/// Slopes closer than this are one line, however significant their difference.
const BEND_MIN: f64 = 0.1;
/// Fewest points on either side of a bend.
const SIDE_MIN: usize = 5;
/// Places at which a bend is looked for.
const BEND_CANDIDATES: usize = 24;
/// Bends removed at most: a floor, and two of the coarse end.
const BENDS_MAX: usize = 3;
/// An error up to this many times its round-off is nothing else.
const FLOOR_HEIGHT: f64 = 3.0;
/// Up to here the finest errors are left out too where more than half of the points lie above. Round-off adds up over
/// the steps to ten times the estimate and more, and one such point, a tenth off, would bend a line that holds to 1e-3.
const NOISY_HEIGHT: f64 = 100.0;
/// Share of the trend that the floor may still be at the finest step used.
const FLOOR_SHARE: f64 = 0.25;
/// Share of the trend that the law of the coarse end may still be at the coarsest step used.
const COARSE_SHARE: f64 = 0.1;

/// The error at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepError {
    /// Step h, positive: a time [s], a tolerance, or 1/evaluations.
    pub step: f64,
    /// Error of either sign; the sign shows oscillation.
    pub error: f64,
    /// Size of the round-off in `error`, in its unit.
    ///
    /// `None` takes `f64::EPSILON` times the number of steps relative to the coarsest one: right for errors
    /// relative to a value of order one.
    pub round_off: Option<f64>,
}

impl StepError {
    /// Error `error` at step `step`, round-off not known.
    pub fn new(step: f64, error: f64) -> Self {
        Self { step, error, round_off: None }
    }
}

/// What the errors do as the step shrinks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// They vanish.
    Converging,
    /// They grow.
    Diverging,
    /// Their sign changes from step to step.
    Oscillating,
    /// They are round-off.
    AtFloor,
    /// Nothing of this can be told.
    Undecided,
}

impl Class {
    /// Name in the contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converging => "converging",
            Self::Diverging => "diverging",
            Self::Oscillating => "oscillating",
            Self::AtFloor => "at-floor",
            Self::Undecided => "undecided",
        }
    }
}

/// Why a point is not in the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Exclusion {
    /// The error is zero.
    ZeroError,
    /// Fine end: the error is round-off.
    RoundOffFloor,
    /// Coarse end: outside the asymptotic range.
    PreAsymptotic,
}

/// One point and what became of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FittedPoint {
    /// Step h.
    pub step: f64,
    /// Error as given.
    pub error: f64,
    /// Whether the fit rests on it.
    pub used: bool,
    /// Why not.
    pub excluded: Option<Exclusion>,
}

/// A fitted `|e| = C h^p`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PowerLaw {
    /// Order p.
    pub order: f64,
    /// 95 % interval of the order (Student t).
    pub interval95: [f64; 2],
    /// Wider interval on which verdicts rest.
    pub verdict_band: [f64; 2],
    /// Constant C: geometric mean of `|e| h^-p` with the fitted p, in the error's unit per `step^p`.
    pub error_constant: f64,
    /// 95 % interval of the constant.
    pub constant_interval: [f64; 2],
    /// Standard deviation of `ln|e|` about the line.
    pub residual_scatter: f64,
}

/// The constant for an order that is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorConstant {
    /// Geometric mean of `|e| h^-p`; with the sign of the errors if they share one.
    pub value: f64,
    /// 95 % interval.
    pub interval95: [f64; 2],
}

/// Whether a fit bears out an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderVerdict {
    /// Converging, the order is in the band, and its integer neighbours are not.
    Pass,
    /// The order is outside the band, or the errors grow.
    Fail,
    /// Neither can be said.
    Undecided,
}

/// The result of [`fit`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrderFit {
    /// The fitted line; `None` when fewer than [`STEPS_MIN`] points are left.
    pub line: Option<PowerLaw>,
    /// What the errors do.
    pub class: Class,
    /// Why this class: one clause with its numbers.
    pub reason: String,
    /// Every point, ascending in step.
    pub points: Vec<FittedPoint>,
}

/// Why there is no fit. None of these is ever a pass.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum FitError {
    /// NaN or infinity.
    #[error("error {error} at step {} is not finite (point {index})", Shown(*.step))]
    NotFinite {
        /// Index from 0 in the points given.
        index: usize,
        /// Step.
        step: f64,
        /// Error.
        error: f64,
    },
    /// A step, or a round-off estimate, that is none.
    #[error("step {} is not a positive number (point {index})", Shown(*.step))]
    BadStep {
        /// Index from 0 in the points given.
        index: usize,
        /// Step.
        step: f64,
    },
    /// Too little to fit.
    #[error("{found} different steps, and an order needs {STEPS_MIN}")]
    TooFewSteps {
        /// Different steps found.
        found: usize,
    },
}

impl OrderFit {
    /// Points in the fit.
    pub fn used(&self) -> usize {
        self.points.iter().filter(|point| point.used).count()
    }

    /// Whether the fit bears out the order `formal`.
    pub fn verdict(&self, formal: f64) -> OrderVerdict {
        let Some(line) = self.line else { return OrderVerdict::Undecided };
        let [low, high] = line.verdict_band;
        let holds = |order: f64| low <= order && order <= high;
        match self.class {
            Class::Diverging => OrderVerdict::Fail,
            // An error that does not fall misses every order that its band excludes, whatever else it does.
            Class::Converging | Class::Undecided if !holds(formal) => OrderVerdict::Fail,
            Class::Converging if !holds(formal - 1.0) && !holds(formal + 1.0) => OrderVerdict::Pass,
            _ => OrderVerdict::Undecided,
        }
    }

    /// The constant C of `e = C h^order` for a known order; `None` with fewer than two points in the fit.
    pub fn constant_at(&self, order: f64) -> Option<ErrorConstant> {
        let used: Vec<_> = self.points.iter().filter(|point| point.used).collect();
        if used.len() < 2 {
            return None;
        }
        let n = used.len() as f64;
        let logs: Vec<f64> = used.iter().map(|point| point.error.abs().ln() - order * point.step.ln()).collect();
        let mean = logs.iter().sum::<f64>() / n;
        let variance = logs.iter().map(|log| (log - mean) * (log - mean)).sum::<f64>() / (n - 1.0);
        let half = student_t(0.05, used.len() - 1) * (variance / n).sqrt();
        let negative = used.iter().all(|point| point.error < 0.0);
        let (low, value, high) = ((mean - half).exp(), mean.exp(), (mean + half).exp());
        Some(if negative {
            ErrorConstant { value: -value, interval95: [-high, -low] }
        } else {
            ErrorConstant { value, interval95: [low, high] }
        })
    }

    /// Share of neighbouring used points whose error falls with the step, 0 to 1; `None` with fewer than two.
    ///
    /// One for an error that is monotone in the step or in the tolerance.
    pub fn falling_share(&self) -> Option<f64> {
        let errors: Vec<f64> = self.points.iter().filter(|point| point.used).map(|point| point.error.abs()).collect();
        let pairs = errors.len().checked_sub(1).filter(|&pairs| pairs > 0)?;
        let falling = errors.windows(2).filter(|pair| pair[0] < pair[1]).count();
        Some(falling as f64 / pairs as f64)
    }
}

/// Fits the order over `points`, in any sequence, with the band of [`FALSE_ALARM_LEVEL`].
///
/// # Errors
/// [`FitError`]: NaN or infinity, a step that is not positive, fewer than [`STEPS_MIN`] different steps.
pub fn fit(points: &[StepError]) -> Result<OrderFit, FitError> {
    fit_at_level(points, FALSE_ALARM_LEVEL)
}

/// As [`fit`], with the verdict band of the two-sided level `level`, 1e-9 to 1.
///
/// # Errors
/// As [`fit`].
pub fn fit_at_level(points: &[StepError], level: f64) -> Result<OrderFit, FitError> {
    let mut sorted = admissible(points)?;
    sorted.sort_by(|a, b| a.step.total_cmp(&b.step));
    let distinct = 1 + sorted.windows(2).filter(|pair| pair[0].step < pair[1].step).count();
    if distinct < STEPS_MIN {
        return Err(FitError::TooFewSteps { found: distinct.min(points.len()) });
    }
    let round_off = round_off(&sorted);
    let excluded = exclusions(&sorted, &round_off);
    let used: Vec<usize> = (0..sorted.len()).filter(|&i| excluded[i].is_none()).collect();
    let x: Vec<f64> = used.iter().map(|&i| sorted[i].step.ln()).collect();
    let y: Vec<f64> = used.iter().map(|&i| sorted[i].error.abs().ln()).collect();
    let line = line(&x, &y).map(|raw| raw.power_law(level));
    let signs: Vec<bool> = used.iter().map(|&i| sorted[i].error < 0.0).collect();
    // How far above round-off the bulk of all points lies: the median, so that single zeros and outliers do not decide.
    let mut heights: Vec<f64> = (0..sorted.len()).map(|i| sorted[i].error.abs() / round_off[i]).collect();
    heights.sort_by(f64::total_cmp);
    let height = heights[heights.len() / 2];
    let (class, reason) = classify(&x, &y, &signs, height, &excluded);
    let points = (0..sorted.len())
        .map(|i| FittedPoint {
            step: sorted[i].step,
            error: sorted[i].error,
            used: excluded[i].is_none() && line.is_some(),
            excluded: excluded[i],
        })
        .collect();
    Ok(OrderFit { line, class, reason, points })
}

/// The points, every number checked.
fn admissible(points: &[StepError]) -> Result<Vec<StepError>, FitError> {
    for (index, &StepError { step, error, round_off }) in points.iter().enumerate() {
        if !error.is_finite() || round_off.is_some_and(|size| !size.is_finite() || size < 0.0) {
            return Err(FitError::NotFinite { index, step, error });
        }
        if !(step > 0.0 && step.is_finite()) {
            return Err(FitError::BadStep { index, step });
        }
    }
    Ok(points.to_vec())
}

/// Round-off of each point, never zero so that ratios exist.
fn round_off(sorted: &[StepError]) -> Vec<f64> {
    let coarsest = sorted.last().map_or(1.0, |point| point.step);
    sorted
        .iter()
        .map(|point| point.round_off.unwrap_or(f64::EPSILON * coarsest / point.step).max(f64::MIN_POSITIVE))
        .collect()
}

/// Which of the points, ascending in step, stay out of the fit.
fn exclusions(sorted: &[StepError], round_off: &[f64]) -> Vec<Option<Exclusion>> {
    let mut excluded: Vec<Option<Exclusion>> =
        sorted.iter().map(|point| (point.error == 0.0).then_some(Exclusion::ZeroError)).collect();
    // The unbroken run at the fine end that does not rise above its round-off. A single small error further up is
    // only an error near its change of sign, and leaving that out would tilt the line.
    let run = |height: f64| (0..sorted.len()).take_while(|&i| sorted[i].error.abs() <= height * round_off[i]).count();
    let noisy = run(NOISY_HEIGHT);
    let floor = if 2 * noisy <= sorted.len() { noisy } else { run(FLOOR_HEIGHT) };
    for reason in &mut excluded[..floor] {
        reason.get_or_insert(Exclusion::RoundOffFloor);
    }
    for _ in 0..BENDS_MAX {
        let used: Vec<usize> = (0..sorted.len()).filter(|&i| excluded[i].is_none()).collect();
        let x: Vec<f64> = used.iter().map(|&i| sorted[i].step.ln()).collect();
        let y: Vec<f64> = used.iter().map(|&i| sorted[i].error.abs().ln()).collect();
        let Some(bend) = bend(&x, &y) else { break };
        let mut heights: Vec<f64> = used
            .iter()
            .filter(|&&i| sorted[i].step.ln() <= bend.at)
            .map(|&i| sorted[i].error.abs() / round_off[i])
            .collect();
        heights.sort_by(f64::total_cmp);
        let round_off_made = heights[heights.len() / 2] <= ROUND_OFF_ALLOWANCE;
        if bend.coarse_slope > 0.0 && round_off_made {
            // Trend and floor are equal at the bend; above it the floor's share falls with the difference in slope.
            // Where the fine side is not yet flat, single roundings bend the line and no law of its own: it alone goes,
            // for the many points above must not yield to a few that are noise.
            let flat = bend.fine_slope < 0.5 * bend.coarse_slope;
            let share = if flat { FLOOR_SHARE.ln() / (bend.coarse_slope - bend.fine_slope) } else { 0.0 };
            let clear = bend.at - share;
            for &i in used.iter().filter(|&&i| sorted[i].step.ln() <= clear) {
                excluded[i] = Some(Exclusion::RoundOffFloor);
            }
        } else {
            // The law of the coarse end fades out below the bend; at most half of the fine side is given up for that.
            let fine = x.partition_point(|&x| x <= bend.at);
            let clear = bend.at + COARSE_SHARE.ln() / (bend.coarse_slope - bend.fine_slope).abs();
            let clear = clear.max(x[fine / 2]);
            for &i in used.iter().filter(|&&i| sorted[i].step.ln() > clear) {
                excluded[i] = Some(Exclusion::PreAsymptotic);
            }
        }
    }
    excluded
}

/// The class of the used points `x, y`, their signs, and the height above round-off of all.
fn classify(x: &[f64], y: &[f64], negative: &[bool], height: f64, excluded: &[Option<Exclusion>]) -> (Class, String) {
    let count = |reason| excluded.iter().filter(|&&e| e == Some(reason)).count();
    let at_floor = count(Exclusion::ZeroError) + count(Exclusion::RoundOffFloor);
    let Some(line) = line(x, y) else {
        return if at_floor > 0 {
            (Class::AtFloor, format!("{at_floor} of {} errors are zero or round-off", excluded.len()))
        } else if x.len() < STEPS_MIN {
            (Class::Undecided, format!("{} points are too few", x.len()))
        } else {
            (Class::Undecided, "the steps are too much alike to carry a slope".to_owned())
        };
    };
    let [low, high] = line.slope_band(CLASS_LEVEL);
    let slope = line.slope;
    if low <= 0.0 && height <= ROUND_OFF_ALLOWANCE {
        return (
            Class::AtFloor,
            format!("the errors do not fall with the step and are {height:.1e} times the round-off"),
        );
    }
    if negative.len() >= STEPS_MIN && alternates(negative) {
        let n = negative.len();
        return (Class::Oscillating, format!("the error changes sign from step to step, {n} points"));
    }
    if low > 0.0 {
        (Class::Converging, format!("the error falls as h^{slope:.2}"))
    } else if high < 0.0 {
        (Class::Diverging, format!("the error grows as h^{slope:.2} while the step shrinks"))
    } else {
        let sure = 100.0 * (1.0 - CLASS_LEVEL);
        (Class::Undecided, format!("slope {slope:.2} is not told from zero: {sure} % within {low:.2} to {high:.2}"))
    }
}

/// Whether at least nine in ten neighbours differ in sign, at least three signs given.
///
/// Random signs do so in 1 of 8 tables of four points, and in 1 of 10¹⁰ of sixty.
pub(super) fn alternates(negative: &[bool]) -> bool {
    let pairs = negative.len().saturating_sub(1);
    let changes = negative.windows(2).filter(|pair| pair[0] != pair[1]).count();
    pairs >= 2 && 10 * changes >= 9 * pairs
}

/// A straight line through `(x, y)` by least squares.
#[derive(Clone, Copy, Debug)]
struct Line {
    slope: f64,
    /// Mean of x and of y: the line passes through it, and the two coefficients there are uncorrelated.
    centre: [f64; 2],
    /// Sum of squared distances of x from its mean.
    spread: f64,
    /// Standard deviation of the residuals.
    scatter: f64,
    dof: usize,
}

impl Line {
    fn slope_band(&self, level: f64) -> [f64; 2] {
        let half = (student_t(level, self.dof) * self.scatter / self.spread.sqrt()).max(ORDER_RESOLUTION);
        [self.slope - half, self.slope + half]
    }

    fn power_law(&self, level: f64) -> PowerLaw {
        let t = student_t(0.05, self.dof);
        let half = t * self.scatter / self.spread.sqrt();
        let [x, y] = self.centre;
        let log_constant = y - self.slope * x;
        let n = (self.dof + 2) as f64;
        let log_half = t * self.scatter * (1.0 / n + x * x / self.spread).sqrt();
        PowerLaw {
            order: self.slope,
            interval95: [self.slope - half, self.slope + half],
            verdict_band: self.slope_band(level),
            error_constant: log_constant.exp(),
            constant_interval: [(log_constant - log_half).exp(), (log_constant + log_half).exp()],
            residual_scatter: self.scatter,
        }
    }
}

/// `None` for fewer than [`STEPS_MIN`] points or fewer than two different x.
fn line(x: &[f64], y: &[f64]) -> Option<Line> {
    let n = x.len();
    if n < STEPS_MIN {
        return None;
    }
    let centre = [x.iter().sum::<f64>() / n as f64, y.iter().sum::<f64>() / n as f64];
    // About the means the two columns are orthogonal, so that the projections are the solution. A singular value
    // decomposition is no safer way here: that of nalgebra 0.35 gives a wrong intercept, by up to 0.5, for one in
    // twenty such designs, because their columns are orthogonal but for rounding.
    let x = DVector::from_iterator(n, x.iter().map(|x| x - centre[0]));
    let y = DVector::from_iterator(n, y.iter().map(|y| y - centre[1]));
    let spread = x.norm_squared();
    // Steps that differ only in their last digits carry no slope.
    if spread <= 1e-20 * n as f64 {
        return None;
    }
    let slope = x.dot(&y) / spread;
    let dof = n - 2;
    let scatter = ((y - slope * x).norm_squared() / dof as f64).sqrt();
    Some(Line { slope: slope * fault!("fit-slope", 1.0, std::f64::consts::LN_2), centre, spread, scatter, dof })
}

/// A place where the line changes its slope.
#[derive(Clone, Copy, Debug)]
struct Bend {
    at: f64,
    fine_slope: f64,
    coarse_slope: f64,
}

/// The best bend of the points, x ascending, if there is one beyond doubt and of a size that matters.
///
/// Two extra parameters, slope and place, so by the F distribution with 2 and n - 4 degrees of freedom, whose tail has
/// a closed form: `P(F > f) = (1 + 2 f/(n - 4))^-((n - 4)/2) = (S_bent/S_straight)^((n - 4)/2)`.
fn bend(x: &[f64], y: &[f64]) -> Option<Bend> {
    let (tail, bend) = best_bend(x, y)?;
    let matters = (bend.coarse_slope - bend.fine_slope).abs() > BEND_MIN;
    (tail < BEND_LEVEL && matters).then_some(bend)
}
/// The bend of least squares over a grid of places, and the tail of its F.
fn best_bend(x: &[f64], y: &[f64]) -> Option<(f64, Bend)> {
    let n = x.len();
    let side = SIDE_MIN.max(n / 8);
    if n < 2 * side {
        return None;
    }
    let straight = line(x, y)?;
    let [x_mean, y_mean] = straight.centre;
    let straight_sum = straight.scatter * straight.scatter * straight.dof as f64;
    let mut best: Option<(f64, Bend)> = None;
    let last = n - 2 * side;
    let stride = last.div_ceil(BEND_CANDIDATES).max(1);
    for skip in (0..=last).step_by(stride) {
        let left = side + skip;
        let at = 0.5 * (x[left - 1] + x[left]);
        // Three columns of the same size: the normal equations lose no more than a few digits of sixteen.
        let row = |i: usize| Vector3::new(1.0, x[i] - x_mean, (x[i] - at).max(0.0));
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (i, &value) in y.iter().enumerate() {
            normal += row(i) * row(i).transpose();
            right += row(i) * (value - y_mean);
        }
        let Some(factor) = normal.cholesky() else { continue };
        let fitted = factor.solve(&right);
        let sum: f64 = (0..n).map(|i| (y[i] - y_mean - row(i).dot(&fitted)).powi(2)).sum();
        if best.is_none_or(|(least, _)| sum < least) {
            best = Some((sum, Bend { at, fine_slope: fitted[1], coarse_slope: fitted[1] + fitted[2] }));
        }
    }
    let (bent_sum, bend) = best?;
    let tail = (bent_sum / straight_sum).powf(0.5 * (n - 4) as f64);
    Some((tail, bend))
}

/// The t that Student's variable with `dof` degrees of freedom exceeds in size with probability `level`.
///
/// `level` 1e-9 to 1 and `dof` at least 1. The distribution is a finite sum in `theta = atan(t/sqrt(dof))` (Abramowitz
/// and Stegun 26.7.3, 26.7.4), so nothing is approximated; inverted by bisection. Relative accuracy 1e-16/level.
///
/// # Panics
/// If `level` or `dof` is outside its range: a mistake of the caller.
pub fn student_t(level: f64, dof: usize) -> f64 {
    assert!((1e-9..=1.0).contains(&level), "level {level} is outside 1e-9..1");
    assert!(dof >= 1, "no degree of freedom");
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..64 {
        let theta = 0.5 * (low + high);
        if 1.0 - inside(theta, dof) > level {
            low = theta;
        } else {
            high = theta;
        }
    }
    (dof as f64).sqrt() * (0.5 * (low + high)).tan()
}

/// Probability that |T| < sqrt(dof) tan(theta).
fn inside(theta: f64, dof: usize) -> f64 {
    let (sin, cos) = theta.sin_cos();
    let odd = dof % 2 == 1;
    let (mut term, mut sum) = if odd { (cos, if dof > 1 { cos } else { 0.0 }) } else { (1.0, 1.0) };
    // Terms run in steps of cos² up to the power dof - 2.
    let mut power = if odd { 3 } else { 2 };
    while power + 2 <= dof {
        let k = power as f64;
        term *= cos * cos * (k - 1.0) / k;
        sum += term;
        power += 2;
    }
    if odd { FRAC_2_PI * (theta + sin * sum) } else { sin * sum }
}

#[cfg(test)]
pub(super) mod noise {
    //! Reproducible noise of the kinds that steps make.

    /// Splitmix64 (Steele, Lea and Flood 2014): small, and good enough to draw steps with.
    pub(crate) struct Noise(pub(crate) u64);

    impl Noise {
        /// Uniform in (0, 1), both ends excluded.
        pub(crate) fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 12) as f64 * 2.0_f64.powi(-52) + 2.0_f64.powi(-53)
        }

        /// Standard normal (Box and Muller).
        pub(crate) fn normal(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
        }

        /// Steps drawn log-uniformly from `coarsest * [10^-decades, 1]`.
        pub(crate) fn steps(&mut self, n: usize, coarsest: f64, decades: f64) -> Vec<f64> {
            (0..n).map(|_| coarsest * 10_f64.powf(-decades * self.uniform())).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use super::noise::Noise;
    use super::*;

    type Kind = fn(&mut Noise) -> f64;

    /// What an event at a random place in the step makes of the error: all within a factor of (0, 1).
    const KINDS: [(&str, Kind); 4] = [
        ("u", |r| r.uniform()),
        ("1 - 4 u²", |r| 1.0 - (2.0 * r.uniform() - 1.0).powi(2)),
        ("|sin|", |r| (std::f64::consts::TAU * r.uniform()).sin().abs()),
        ("u - 0.3", |r| r.uniform() - 0.3),
    ];

    fn power(noise: &mut Noise, n: usize, order: f64, kind: Kind) -> Vec<StepError> {
        let steps = noise.steps(n, 1e-2, 3.0);
        // Round-off far below, so that only the noise is looked at.
        let point = |h: f64, u: f64| StepError { step: h, error: h.powf(order) * u, round_off: Some(1e-30) };
        steps.into_iter().map(|h| point(h, kind(noise))).collect()
    }

    #[test]
    fn residuals_of_the_line_are_orthogonal_to_both_columns() {
        // Centred columns are orthogonal but for rounding: the case in which the decomposition of nalgebra 0.35 fails.
        let mut noise = Noise(12);
        for _ in 0..300 {
            let x: Vec<f64> = noise.steps(120, 1e-2, 3.0).iter().map(|h| h.ln()).collect();
            let y: Vec<f64> = x.iter().map(|x| 2.0 * x + noise.uniform().ln()).collect();
            let line = line(&x, &y).unwrap();
            let residual = |i: usize| y[i] - line.centre[1] - line.slope * (x[i] - line.centre[0]);
            let (sum, moment, square) = (0..120)
                .map(|i| (residual(i), x[i] - line.centre[0]))
                .fold((0.0, 0.0, 0.0), |(sum, moment, square), (r, x)| (sum + r, moment + r * x, square + r * r));
            assert!(f64::abs(sum) < 1e-10 && f64::abs(moment) < 1e-10, "{sum:e} {moment:e}");
            assert!((square / 118.0 / line.scatter.powi(2) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn student_t_matches_the_tables() {
        for (level, dof, expected) in [
            (0.05, 1, 12.706_204_736),
            (0.05, 2, 4.302_652_730),
            (0.05, 3, 3.182_446_305),
            (0.05, 58, 2.001_717_484),
            (0.001, 4, 8.610_301_581),
            (0.001, 30, 3.645_958_635),
            (1e-6, 1, 636_619.772_367),
        ] {
            let t = student_t(level, dof);
            assert!((t / expected - 1.0).abs() < 1e-9, "t({level}, {dof}) = {t}, not {expected}");
        }
    }

    #[test]
    fn bands_keep_their_level_for_the_noise_of_steps() {
        let mut noise = Noise(1);
        for (name, kind) in KINDS {
            let t = student_t(1e-3, 58);
            let (fits, mut misses) = (25_000, 0);
            for _ in 0..fits {
                let x: Vec<f64> = noise.steps(60, 1e-2, 3.0).iter().map(|h| h.ln()).collect();
                let y: Vec<f64> = x.iter().map(|x| 2.0 * x + kind(&mut noise).abs().ln()).collect();
                let line = line(&x, &y).unwrap();
                misses += usize::from((line.slope - 2.0).abs() > t * line.scatter / line.spread.sqrt());
            }
            // 25 expected of a normal noise; 45 is four standard deviations above.
            assert!(misses <= 45, "{name}: {misses} of {fits} outside the band of 1e-3");
        }
    }

    #[test]
    fn a_right_order_passes_and_one_off_by_one_fails_for_every_noise() {
        let mut noise = Noise(2);
        for (name, kind) in KINDS {
            for order in [1.0, 2.0] {
                for _ in 0..300 {
                    let fit = fit(&power(&mut noise, 120, order, kind)).unwrap();
                    let line = fit.line.unwrap();
                    assert_eq!(fit.verdict(order), OrderVerdict::Pass, "{name}, order {order}: {line:?}");
                    for off in [-1.0, 1.0] {
                        assert_eq!(fit.verdict(order + off), OrderVerdict::Fail, "{name}, order {order}: {line:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_order_off_by_a_half_fails_with_120_points() {
        let mut noise = Noise(3);
        for (name, kind) in KINDS {
            let trials = 400;
            let caught = (0..trials)
                .filter(|_| fit(&power(&mut noise, 120, 1.5, kind)).unwrap().verdict(2.0) == OrderVerdict::Fail)
                .count();
            assert!(caught * 100 >= trials * 99, "{name}: {caught} of {trials}");
        }
    }

    #[test]
    fn smooth_errors_give_order_and_constant_to_the_next_term() {
        let mut noise = Noise(4);
        for order in [1.0, 2.0] {
            let points: Vec<_> = noise
                .steps(60, 1e-2, 3.0)
                .into_iter()
                .map(|h| StepError::new(h, -3.0 * h.powf(order) * (1.0 + h)))
                .collect();
            let fit = fit(&points).unwrap();
            let line = fit.line.unwrap();
            assert!((line.order - order).abs() < 0.01, "{line:?}");
            assert_eq!(fit.verdict(order), OrderVerdict::Pass);
            let constant = fit.constant_at(order).unwrap();
            assert!((constant.value / -3.0 - 1.0).abs() < 0.01, "{constant:?}");
            assert!(constant.interval95[0] < constant.value && constant.value < constant.interval95[1]);
            assert_eq!(fit.falling_share(), Some(1.0));
        }
    }

    #[test]
    fn a_round_off_floor_is_excluded_and_marked() {
        let mut noise = Noise(5);
        for _ in 0..50 {
            let points: Vec<_> = noise
                .steps(60, 1e-2, 6.0)
                .into_iter()
                .map(|h| StepError::new(h, h * h * (0.1 + noise.uniform()) + 1e-14 * noise.normal()))
                .collect();
            let fit = fit(&points).unwrap();
            assert_eq!(fit.verdict(2.0), OrderVerdict::Pass, "{:?}", fit.line);
            assert!(fit.points[0].excluded == Some(Exclusion::RoundOffFloor) && !fit.points[0].used);
            assert!(fit.points.iter().filter(|p| p.used).all(|p| p.step > 1e-7), "floor in the fit");
        }
    }

    #[test]
    fn a_few_points_bent_by_round_off_do_not_decide_over_the_many_above() {
        // A tenth of the finest error is noise, and nothing levels off: an exit velocity that is nearly exact.
        for seed in 0..400 {
            let mut noise = Noise(seed);
            let points: Vec<_> = noise
                .steps(60, 1e-2, 3.0)
                .into_iter()
                .map(|h| StepError::new(h, 0.1 * h * h + 1e-12 * noise.normal()))
                .collect();
            let fit = fit(&points).unwrap();
            assert_eq!(fit.verdict(2.0), OrderVerdict::Pass, "{seed}: {:?}", fit.line);
            assert!(fit.used() >= 30, "{seed}: {} of 60", fit.used());
        }
    }

    #[test]
    fn one_finest_error_a_third_off_by_round_off_does_not_bend_the_line() {
        // Seed 141 of the suite: the exit velocity without drag, 44 times the estimated round-off at the finest step.
        for seed in 0..400 {
            let mut noise = Noise(seed);
            let steps = noise.steps(60, 1.0, 3.0);
            let finest = steps.iter().copied().fold(f64::INFINITY, f64::min);
            let points: Vec<_> = steps
                .into_iter()
                .map(|h| {
                    StepError::new(h, 7.5e-6 * h * h * if h == finest { 1.31 } else { 1.0 + 3e-3 * noise.normal() })
                })
                .collect();
            let fit = fit(&points).unwrap();
            assert_eq!(fit.verdict(2.0), OrderVerdict::Pass, "{seed}: {:?}", fit.line);
            assert!(fit.used() >= 30, "{seed}: {} of 60", fit.used());
        }
    }

    #[test]
    fn an_error_that_levels_off_above_round_off_is_no_floor_and_fails() {
        // A method that converges to something else by one part in a million.
        let mut noise = Noise(6);
        let points: Vec<_> = noise.steps(60, 1e-1, 4.0).into_iter().map(|h| StepError::new(h, h * h + 1e-6)).collect();
        let fit = fit(&points).unwrap();
        assert_eq!(fit.verdict(2.0), OrderVerdict::Fail, "{:?} {}", fit.line, fit.reason);
        assert!(fit.points.iter().all(|point| point.excluded != Some(Exclusion::RoundOffFloor)));
    }

    #[test]
    fn the_fine_end_decides_between_two_orders() {
        let mut noise = Noise(7);
        let points: Vec<_> = noise
            .steps(80, 1.0, 5.0)
            .into_iter()
            .map(|h| StepError::new(h, (h * h + 1e-3 * h) * (0.5 + noise.uniform())))
            .collect();
        let fit = fit(&points).unwrap();
        assert_eq!(fit.verdict(1.0), OrderVerdict::Pass, "{:?}", fit.line);
        assert_eq!(fit.points.last().unwrap().excluded, Some(Exclusion::PreAsymptotic));
    }

    #[test]
    fn pure_round_off_and_zeros_are_at_the_floor_and_never_pass() {
        let mut noise = Noise(8);
        let steps = noise.steps(40, 1e-2, 3.0);
        let round_off: Vec<_> = steps.iter().map(|&h| StepError::new(h, 1e-16 * noise.normal() / h.sqrt())).collect();
        let zeros: Vec<_> = steps.iter().map(|&h| StepError::new(h, 0.0)).collect();
        for points in [round_off, zeros] {
            let fit = fit(&points).unwrap();
            assert_eq!(fit.class, Class::AtFloor, "{}", fit.reason);
            assert_eq!(fit.verdict(2.0), OrderVerdict::Undecided);
        }
    }

    #[test]
    fn diverging_constant_and_alternating_errors_never_pass() {
        let mut noise = Noise(9);
        let steps = noise.steps(40, 1e-2, 3.0);
        let with =
            |f: &dyn Fn(f64) -> f64| fit(&steps.iter().map(|&h| StepError::new(h, f(h))).collect::<Vec<_>>()).unwrap();
        let diverging = with(&|h| 1e-4 / h);
        assert_eq!((diverging.class, diverging.verdict(1.0)), (Class::Diverging, OrderVerdict::Fail));
        let constant = with(&|_| 1e-4);
        assert_eq!((constant.class, constant.verdict(2.0)), (Class::Undecided, OrderVerdict::Fail));
        let alternating: Vec<_> = (0..12)
            .map(|i| StepError::new(0.5_f64.powi(i), 0.1 * 0.25_f64.powi(i) * f64::from(1 - 2 * (i % 2))))
            .collect();
        let alternating = fit(&alternating).unwrap();
        assert_eq!((alternating.class, alternating.verdict(2.0)), (Class::Oscillating, OrderVerdict::Undecided));
    }

    #[test]
    fn noise_does_not_converge() {
        let mut noise = Noise(10);
        let fits = 3_000;
        let converging = (0..fits)
            .filter(|_| {
                let points: Vec<_> =
                    noise.steps(40, 1e-2, 3.0).into_iter().map(|h| StepError::new(h, noise.normal())).collect();
                fit(&points).unwrap().class == Class::Converging
            })
            .count();
        assert!(converging <= 8, "{converging} of {fits}");
    }

    #[test]
    fn what_is_not_a_number_is_an_error_and_not_a_fit() {
        let good: Vec<_> = (1..=6).map(|i| StepError::new(f64::from(i), f64::from(i))).collect();
        let with = |point| [good.clone(), vec![point]].concat();
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(matches!(fit(&with(StepError::new(7.0, bad))), Err(FitError::NotFinite { index: 6, .. })));
            assert!(matches!(fit(&with(StepError::new(bad, 7.0))), Err(FitError::BadStep { index: 6, .. })));
        }
        assert!(matches!(fit(&with(StepError::new(0.0, 1.0))), Err(FitError::BadStep { .. })));
        assert_eq!(fit(&good[..3]), Err(FitError::TooFewSteps { found: 3 }));
        assert_eq!(fit(&[]), Err(FitError::TooFewSteps { found: 0 }));
        assert_eq!(fit(&vec![good[0]; 9]), Err(FitError::TooFewSteps { found: 1 }));
    }

    /// A fit of these errors at the steps 1, 2, 3, ..., all of them used, as if made by [`fit`].
    fn of_errors(errors: &[f64]) -> OrderFit {
        let point =
            |(i, &error): (usize, &f64)| FittedPoint { step: 1.0 + i as f64, error, used: true, excluded: None };
        let points = errors.iter().enumerate().map(point).collect();
        OrderFit { line: None, class: Class::Undecided, reason: String::new(), points }
    }

    #[track_caller]
    fn assert_close(values: &[f64], expected: &[f64]) {
        for (value, expected) in values.iter().zip(expected) {
            assert!((value / expected - 1.0).abs() < 1e-13, "{value:?}, not {expected:?}, in {values:?}");
        }
    }

    /// Errors `h^slope` on both sides of h = 1, `counts` of them and evenly spaced in ln h, `height` times their
    /// round-off: the bend is at ln h = 0, halfway between two points.
    fn bent(counts: [usize; 2], spacing: f64, slopes: [f64; 2], height: impl Fn(usize) -> f64) -> Vec<StepError> {
        (0..counts[0] + counts[1])
            .map(|i| {
                let x = spacing * (i as f64 - counts[0] as f64 + 0.5);
                let error = (slopes[usize::from(x > 0.0)] * x).exp();
                StepError { step: x.exp(), error, round_off: Some(error / height(i)) }
            })
            .collect()
    }

    /// How many of `points`, ascending in step, go for `reason`; no other reason occurs, and none is left beside them.
    fn excluded_for(reason: Exclusion, points: &[StepError]) -> usize {
        let excluded = exclusions(points, &round_off(points));
        let count = excluded.iter().filter(|&&e| e == Some(reason)).count();
        assert!(excluded.iter().all(|&e| e.is_none() || e == Some(reason)), "{excluded:?}");
        let one_block = match reason {
            Exclusion::PreAsymptotic => excluded[points.len() - count..].iter().all(Option::is_some),
            _ => excluded[..count].iter().all(Option::is_some),
        };
        assert!(one_block, "{excluded:?}");
        count
    }

    #[test]
    fn order_constant_and_their_intervals_are_those_of_the_normal_equations() {
        // The uncentred normal equations of five points and their covariance, t by the incomplete beta function: 50 digits.
        let errors = [0.5, -1.0, 3.0, -7.5, 15.0];
        let points: Vec<_> =
            [2.0, 3.0, 5.0, 7.0, 11.0].iter().zip(errors).map(|(&h, error)| StepError::new(h, error)).collect();
        let fit = fit_at_level(&points, 0.01).unwrap();
        let line = fit.line.unwrap();
        assert_close(&[line.order, line.residual_scatter], &[2.068_194_788_581_501_3, 0.126_385_349_190_982_39]);
        assert_close(&line.interval95, &[1.769_819_522_684_142_8, 2.366_570_054_478_859_7]);
        assert_close(&line.verdict_band, &[1.520_571_136_461_884_1, 2.615_818_440_701_118_4]);
        assert_close(&[line.error_constant], &[0.113_273_365_139_022_55]);
        assert_close(&line.constant_interval, &[0.068_982_412_445_190_83, 0.186_001_834_309_766_05]);
        let constant = fit.constant_at(2.0).unwrap();
        assert_close(&[constant.value], &[0.125_893_690_361_844_93]);
        assert_close(&constant.interval95, &[0.108_639_711_124_912_03, 0.145_887_918_044_083_63]);
        let negative: Vec<_> = points.iter().map(|p| StepError::new(p.step, -p.error.abs())).collect();
        let turned = super::fit(&negative).unwrap().constant_at(2.0).unwrap();
        let [low, high] = constant.interval95;
        assert_eq!(turned, ErrorConstant { value: -constant.value, interval95: [-high, -low] });
    }

    #[test]
    fn a_constant_needs_two_points_and_of_two_is_known_in_closed_form() {
        assert_eq!(of_errors(&[]).constant_at(1.0), None);
        assert_eq!(of_errors(&[3.0]).constant_at(1.0), None);
        // C = 2 and 8: the mean of the logarithms is ln 4, its standard error ln 2; with one degree of freedom
        // t = tan(0.475 pi).
        // Constants of any size: the two logarithms near -693 differ as much.
        let factor = 2.0_f64.powf((0.475 * std::f64::consts::PI).tan());
        for size in [1.0, 2.0_f64.powi(-1000)] {
            let ErrorConstant { value, interval95: [low, high] } =
                of_errors(&[2.0 * size, 16.0 * size]).constant_at(1.0).unwrap();
            for (bound, expected) in [(low, 4.0 / factor), (value, 4.0), (high, 4.0 * factor)] {
                assert!((bound / size / expected - 1.0).abs() < 1e-12, "{bound:e}, not {expected:e} times {size:e}");
            }
        }
    }

    #[test]
    fn falling_share_counts_only_pairs_that_fall_and_needs_one() {
        assert_eq!(of_errors(&[]).falling_share(), None);
        assert_eq!(of_errors(&[1.0]).falling_share(), None);
        assert_eq!(of_errors(&[2.0, 1.0]).falling_share(), Some(0.0));
        // Rising, equal, falling, rising in size, from the fine end: two of four.
        assert_eq!(of_errors(&[1.0, -2.0, 2.0, 1.5, 3.0]).falling_share(), Some(0.5));
        let mut one_left = of_errors(&[1.0, 2.0]);
        one_left.points[0].used = false;
        assert_eq!(one_left.falling_share(), None);
    }

    #[test]
    fn an_order_passes_only_where_its_band_holds_neither_neighbour() {
        let verdict = |class: Class, verdict_band: [f64; 2]| {
            let points: Vec<_> = (1..9).map(|i| StepError::new(f64::from(i), f64::from(i))).collect();
            let line = fit(&points).unwrap().line.map(|line| PowerLaw { verdict_band, ..line });
            OrderFit { line, class, ..of_errors(&[]) }.verdict(2.0)
        };
        for (band, expected) in [
            ([1.5, 2.5], OrderVerdict::Pass),
            ([2.0, 2.9], OrderVerdict::Pass),
            ([1.1, 2.0], OrderVerdict::Pass),
            ([1.0, 2.1], OrderVerdict::Undecided),
            ([1.9, 3.0], OrderVerdict::Undecided),
            ([0.5, 3.5], OrderVerdict::Undecided),
            ([2.1, 2.9], OrderVerdict::Fail),
            ([1.1, 1.9], OrderVerdict::Fail),
        ] {
            assert_eq!(verdict(Class::Converging, band), expected, "{band:?}");
            let undecided = if expected == OrderVerdict::Fail { expected } else { OrderVerdict::Undecided };
            assert_eq!(verdict(Class::Undecided, band), undecided, "{band:?}");
            assert_eq!(verdict(Class::Diverging, band), OrderVerdict::Fail);
            for class in [Class::Oscillating, Class::AtFloor] {
                assert_eq!(verdict(class, band), OrderVerdict::Undecided);
            }
        }
    }

    #[test]
    fn names_of_the_classes_are_those_of_the_contract() {
        for class in [Class::Converging, Class::Diverging, Class::Oscillating, Class::AtFloor, Class::Undecided] {
            assert_eq!(serde_json::to_value(class).unwrap(), class.name());
        }
        assert_eq!(Class::AtFloor.name(), "at-floor");
    }

    #[test]
    fn a_round_off_is_a_finite_size_and_may_be_zero() {
        let with = |size: f64| {
            let points: Vec<_> = (1..=6)
                .map(|i| StepError {
                    round_off: (i == 3).then_some(size),
                    ..StepError::new(f64::from(i), f64::from(i))
                })
                .collect();
            fit(&points).map(|fit| fit.used())
        };
        assert_eq!(with(0.0), Ok(6));
        for size in [-1e-300, -1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            assert!(matches!(with(size), Err(FitError::NotFinite { index: 2, .. })), "{size}");
        }
    }

    #[test]
    fn one_error_near_round_off_among_many_above_is_no_floor() {
        // The median decides, of 8 points and of 9: 1e-4 is 1e12 times the round-off, the one error below 100 times.
        for n in [8, 9] {
            let points: Vec<_> = (1..=n)
                .map(|i| StepError {
                    step: f64::from(i),
                    error: if i == 5 { 1e-14 } else { 1e-4 },
                    round_off: Some(1e-16),
                })
                .collect();
            let fit = fit(&points).unwrap();
            assert_eq!((fit.class, fit.used()), (Class::Undecided, points.len()), "{}", fit.reason);
        }
    }

    #[test]
    fn noisy_points_go_up_to_half_of_all_and_beyond_that_pure_round_off_alone() {
        let run = |heights: [f64; 8]| {
            let point = |(i, height): (usize, f64)| StepError {
                step: 1.0 + i as f64,
                error: if i % 2 == 0 { height } else { -height },
                round_off: Some(1.0),
            };
            let points: Vec<_> = heights.into_iter().enumerate().map(point).collect();
            excluded_for(Exclusion::RoundOffFloor, &points)
        };
        let high = 1e6;
        assert_eq!(run([50.0, 4.0, 9.0, 100.0, high, high, high, high]), 4);
        assert_eq!(run([50.0, 4.0, 9.0, 100.1, high, high, high, high]), 3);
        assert_eq!(run([50.0, 4.0, 9.0, 100.0, 7.0, high, high, high]), 0);
        assert_eq!(run([3.0, 1.0, 0.5, 3.0, 3.0, 3.1, high, high]), 5);
    }

    #[test]
    fn a_floor_goes_with_the_points_where_it_is_a_quarter_of_the_trend() {
        // Above the bend the floor's share falls as h^-(coarse - fine): to 1/4 at ln h = ln 4/(coarse - fine).
        let floor = |slopes| excluded_for(Exclusion::RoundOffFloor, &bent([17, 17], 0.1, slopes, |_| 300.0));
        // Round-off that grows as steps are added: 0.4621, beyond 5 points.
        assert_eq!(floor([-1.0, 2.0]), 17 + 5);
        // 0.9242, beyond 9 points.
        assert_eq!(floor([0.5, 2.0]), 17 + 9);
        // The fine side falls at more than half the slope of the trend: no floor, and it goes alone.
        assert_eq!(floor([1.2, 2.0]), 17);
    }

    #[test]
    fn the_law_of_the_coarse_end_goes_where_it_is_a_tenth_or_in_half_of_the_fine_side() {
        let coarse = |slopes| excluded_for(Exclusion::PreAsymptotic, &bent([24, 10], 0.1, slopes, |_| 1e6));
        // Its share falls to 1/10 at ln h = -ln 10/3 = -0.7675, 8 points below the bend.
        assert_eq!(coarse([1.0, 4.0]), 10 + 8);
        assert_eq!(coarse([4.0, 1.0]), 10 + 8);
        // -ln 10/0.5 = -4.6 is beyond the finest step: of the 24 points below the bend the lower half and the next one stay.
        assert_eq!(coarse([1.0, 1.5]), 10 + 11);
    }

    #[test]
    fn the_median_above_round_off_tells_a_floor_from_another_law() {
        // Of the 24 points below the bend k are 10 times their round-off, the others 1e6 times.
        let points = |k: usize| bent([24, 10], 0.1, [1.0, 4.0], |i| if (1..=k).contains(&i) { 10.0 } else { 1e6 });
        assert_eq!(excluded_for(Exclusion::PreAsymptotic, &points(12)), 10 + 8);
        // ln 4/3 = 0.4621 above the bend: 5 points.
        assert_eq!(excluded_for(Exclusion::RoundOffFloor, &points(13)), 24 + 5);
    }

    #[test]
    fn what_is_left_of_too_few_points_says_so() {
        let of = |errors: &[f64]| {
            let point = |(i, &error): (usize, &f64)| StepError { step: 1.0 + i as f64, error, round_off: Some(1.0) };
            let fit = fit(&errors.iter().enumerate().map(point).collect::<Vec<_>>()).unwrap();
            assert_eq!((fit.line, fit.used(), fit.verdict(1.0)), (None, 0, OrderVerdict::Undecided));
            (fit.class, fit.reason)
        };
        // Three zeros and two errors of the size of their round-off.
        let floor = (Class::AtFloor, "5 of 8 errors are zero or round-off".to_owned());
        assert_eq!(of(&[0.0, 1.0, 0.0, -1.0, 0.0, 1e6, 2e6, 3e6]), floor);
        // Of five points below a bend two give way to the law above it, and three make no line.
        let bend = fit(&bent([5, 5], 0.1, [1.0, 1.5], |_| 1e6)).unwrap();
        assert_eq!((bend.line, bend.class), (None, Class::Undecided));
        assert_eq!(bend.reason, "3 points are too few");
    }

    #[test]
    fn a_slope_no_larger_than_the_resolution_is_not_told_from_zero() {
        // Without noise the half-width is ORDER_RESOLUTION: 0.05 - 0.05 = 0 is not above zero, nor -0.05 + 0.05 below.
        let class = |slope: f64| {
            let x = [-2.0, -1.0, 1.0, 2.0];
            classify(&x, &x.map(|x| slope * x), &[false; 4], 1e9, &[None; 4]).0
        };
        for (slope, expected) in [
            (ORDER_RESOLUTION, Class::Undecided),
            (-ORDER_RESOLUTION, Class::Undecided),
            (0.0, Class::Undecided),
            (0.051, Class::Converging),
            (-0.051, Class::Diverging),
        ] {
            assert_eq!(class(slope), expected, "{slope}");
        }
    }

    #[test]
    fn steps_alike_to_ten_digits_carry_no_slope() {
        // Standard deviation of ln h on either side of 1e-10, for four points and for forty.
        for n in [4, 40] {
            let y: Vec<f64> = (0..n).map(f64::from).collect();
            let has_slope = |sigma: f64| {
                let x: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { sigma } else { -sigma }).collect();
                line(&x, &y).is_some()
            };
            assert!(!has_slope(0.0) && !has_slope(0.99e-10) && has_slope(1.01e-10), "{n}");
        }
        let steps = [1.0, 1.0_f64.next_up(), 1.0 + 2.0 * f64::EPSILON, 1.0 + 3.0 * f64::EPSILON];
        let fit = fit(&steps.map(|h| StepError::new(h, h))).unwrap();
        assert_eq!((fit.line, fit.class, fit.used()), (None, Class::Undecided, 0));
        assert_eq!(fit.reason, "the steps are too much alike to carry a slope");
    }

    #[test]
    fn a_bend_is_the_least_squares_one_with_the_tail_of_its_f() {
        // Ten points leave one place, between the fifth and the sixth. Slopes and sums by the normal equations in 40 digits.
        let x = [0.0, 1.0, 3.0, 4.0, 6.0, 9.0, 10.0, 12.0, 15.0, 16.0];
        let y = [0.0, 2.0, 3.0, 4.0, 7.0, 9.0, 12.0, 18.0, 27.0, 28.0];
        let (tail, bend) = best_bend(&x, &y).unwrap();
        assert_eq!(bend.at, 7.5);
        assert_close(&[bend.fine_slope], &[0.740_037_695_207_323_6]);
        assert_close(&[bend.coarse_slope], &[0.740_037_695_207_323_6 + 1.861_066_235_864_297_3]);
        // (7.8160/58.757)^3
        assert!((tail / 0.002_353_811_879_770_368_3 - 1.0).abs() < 1e-12, "{tail}");
        assert!(best_bend(&x[1..], &y[1..]).is_none());
    }

    #[test]
    fn a_bend_of_steps_of_any_size_is_as_sharp() {
        for (base, n) in [(-690.0, 10), (-690.0, 34), (690.0, 34), (0.0, 34)] {
            let x: Vec<f64> = (0..n).map(|i| base + 0.1 * f64::from(i)).collect();
            let middle = x.len() / 2;
            let at = 0.5 * (x[middle - 1] + x[middle]);
            let y: Vec<f64> = x.iter().map(|x| (x - at) + 2.0 * (x - at).max(0.0)).collect();
            let (_, bend) = best_bend(&x, &y).unwrap();
            assert_eq!(bend.at, at);
            assert!((bend.fine_slope - 1.0).abs() < 1e-12 && (bend.coarse_slope - 3.0).abs() < 1e-12, "{bend:?}");
        }
    }

    #[test]
    fn an_eighth_of_the_points_stays_on_either_side_of_a_bend() {
        // 80 points and a kink behind 7 of them, from either end: the nearest place looked at is behind 10.
        let x: Vec<f64> = (0..80).map(f64::from).collect();
        for (kink, nearest) in [(6.5, 9.5), (72.5, 69.5)] {
            let y: Vec<f64> = x.iter().map(|x| (x - kink).max(0.0)).collect();
            assert_eq!(best_bend(&x, &y).unwrap().1.at, nearest);
        }
    }

    #[test]
    fn slopes_that_meet_a_limit_exactly_are_on_its_near_side() {
        // Fits whose slopes stand at a limit to the last bit; rounding makes a part of these lines such.
        let (mut flat, mut half, mut tenth) = (0, 0, 0);
        for k in 0..300 {
            let spacing = 0.1 + 1e-3 * f64::from(k);
            let fitted = |slopes: [f64; 2], height: f64| {
                let points = bent([9, 9], spacing, slopes, |_| height);
                let x: Vec<f64> = points.iter().map(|point| point.step.ln()).collect();
                let y: Vec<f64> = points.iter().map(|point| point.error.ln()).collect();
                (best_bend(&x, &y).unwrap(), bend(&x, &y).is_some(), points)
            };
            // A coarse end that does not fall is no trend that a floor could end.
            let ((_, bend), _, points) = fitted([1.0, 0.0], 300.0);
            if bend.coarse_slope == 0.0 {
                flat += 1;
                assert!(excluded_for(Exclusion::PreAsymptotic, &points) >= 9);
            }
            // At half the slope of the trend the fine side is not flat, and goes alone.
            let ((_, bend), _, points) = fitted([1.0, 2.0], 300.0);
            if bend.fine_slope == 0.5 * bend.coarse_slope {
                half += 1;
                assert_eq!(excluded_for(Exclusion::RoundOffFloor, &points), 9);
            }
            // Slopes a tenth apart are one line.
            let ((tail, bend), bends, _) = fitted([0.0, BEND_MIN], 1e6);
            if bend.coarse_slope - bend.fine_slope == BEND_MIN {
                tenth += 1;
                assert!(tail < BEND_LEVEL && !bends);
            }
        }
        assert!(flat > 0 && half > 0 && tenth > 0, "{flat} {half} {tenth}");
    }

    #[test]
    fn zero_is_exceeded_with_certainty() {
        for dof in [1, 2, 58] {
            let t = student_t(1.0, dof);
            assert!((0.0..1e-18).contains(&t), "{t:e}");
        }
    }
}
