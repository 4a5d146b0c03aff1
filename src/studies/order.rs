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
//! Before the fit, and each with its reason stored at the point ([`Exclusion`]):
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

use std::convert::Infallible;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use nalgebra::{DVector, Matrix3, Vector3};
use serde::Serialize;
use thiserror::Error;

use super::verdict::Verdict;

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
/// does not cover the truth. Orders closer than this are not distinguished.
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
/// If at least half of the points lie above this multiple of the round-off estimate, all finest points below it are
/// dropped: accumulated round-off exceeds the estimate tenfold, and one polluted point can bend the fit.
const NOISY_HEIGHT: f64 = 100.0;
/// An error up to this many times its round-off is an accident if both neighbours are [`ACCIDENT_RATIO`] times as large.
const ACCIDENT_HEIGHT: f64 = 30.0;
/// See [`ACCIDENT_HEIGHT`].
const ACCIDENT_RATIO: f64 = 1e6;
/// Share of the trend that the floor may still be at the finest step used.
const FLOOR_SHARE: f64 = 0.25;
/// Share of the trend that the law of the coarse end may still be at the coarsest step used.
const COARSE_SHARE: f64 = 0.1;

/// The error at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepError {
    /// Step h, positive: a time (s), a tolerance, or 1/evaluations.
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, strum::IntoStaticStr)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Class {
    /// They vanish.
    Converging,
    /// They grow.
    Diverging,
    /// Their sign changes from step to step.
    Oscillating,
    /// They are round-off.
    AtFloor,
    /// None of this can be decided.
    #[default]
    Undecided,
}

impl Class {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Why a point is not in the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Exclusion {
    /// The error is zero.
    ZeroError,
    /// Fine end: the error is round-off.
    RoundOffFloor,
    /// Coarse end: outside the asymptotic range.
    PreAsymptotic,
}

impl Exclusion {
    /// Why, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::ZeroError => "its error is zero",
            Self::RoundOffFloor => "its error is round-off",
            Self::PreAsymptotic => "too coarse",
        }
    }
}

/// One point, and whether the fit uses it.
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

/// A law `|e| = C h^p`, from errors or from the values themselves.
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
}

/// The result of [`fit`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrderFit {
    /// The fitted line; `None` when fewer than [`STEPS_MIN`] points are left.
    pub line: Option<PowerLaw>,
    /// 95 % interval of the constant of the line.
    pub constant_interval: Option<[f64; 2]>,
    /// What the errors do.
    pub class: Class,
    /// Why this class: one clause with its numbers.
    pub reason: String,
    /// Every point, ascending in step.
    pub points: Vec<FittedPoint>,
}

/// Why a table of steps gives no fit. None of these is ever a pass.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum FitError {
    /// NaN or infinity.
    #[error("{value} at step {} is not finite (point {index})", Shown(*.step))]
    NotFinite {
        /// Index from 0 in the points given.
        index: usize,
        /// Step.
        step: f64,
        /// Value or error.
        value: f64,
    },
    /// A step that is none.
    #[error("step {} is not a positive number (point {index})", Shown(*.step))]
    BadStep {
        /// Index from 0 in the points given.
        index: usize,
        /// Step.
        step: f64,
    },
    /// Too few points to judge.
    #[error("{found} different steps, and an order needs {needed}")]
    TooFewSteps {
        /// Different steps found.
        found: usize,
        /// Different steps needed.
        needed: usize,
    },
    /// One step with two values, where there is no noise.
    #[error("step {} has two values, {} and {}", Shown(*.step), Shown(*.first), Shown(*.second))]
    TwoValues {
        /// Step.
        step: f64,
        /// One value.
        first: f64,
        /// Another value.
        second: f64,
    },
}

impl FitError {
    /// Refuses a point whose numbers are none; `round_off` must not be negative.
    pub(super) fn check(index: usize, step: f64, value: f64, round_off: f64) -> Result<(), Self> {
        if !value.is_finite() || !round_off.is_finite() || round_off < 0.0 {
            return Err(Self::NotFinite { index, step, value });
        }
        if !(step > 0.0 && step.is_finite()) {
            return Err(Self::BadStep { index, step });
        }
        Ok(())
    }
}

impl OrderFit {
    /// Points in the fit.
    pub fn used(&self) -> usize {
        self.points.iter().filter(|point| point.used).count()
    }

    /// Whether the fit confirms the order `formal`.
    pub fn verdict(&self, formal: f64) -> Verdict {
        let Some(line) = self.line else { return Verdict::Undecided };
        let [low, high] = line.verdict_band;
        let holds = |order: f64| low <= order && order <= high;
        match self.class {
            Class::Diverging => Verdict::Failed,
            // An error that does not fall misses every order that its band excludes, whatever else it does.
            Class::Converging | Class::Undecided if !holds(formal) => Verdict::Failed,
            Class::Converging if !holds(formal - 1.0) && !holds(formal + 1.0) => Verdict::Passed,
            _ => Verdict::Undecided,
        }
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
    for (index, point) in points.iter().enumerate() {
        FitError::check(index, point.step, point.error, point.round_off.unwrap_or(0.0))?;
    }
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.step.total_cmp(&b.step));
    let distinct = 1 + sorted.windows(2).filter(|pair| pair[0].step < pair[1].step).count();
    if distinct < STEPS_MIN {
        return Err(FitError::TooFewSteps { found: distinct.min(points.len()), needed: STEPS_MIN });
    }
    let round_off = round_off(&sorted);
    let excluded = exclusions(&sorted, &round_off);
    let used: Vec<usize> = (0..sorted.len()).filter(|&i| excluded[i].is_none()).collect();
    let x: Vec<f64> = used.iter().map(|&i| sorted[i].step.ln()).collect();
    let y: Vec<f64> = used.iter().map(|&i| sorted[i].error.abs().ln()).collect();
    let raw = line(&x, &y);
    let (line, constant_interval) = (raw.map(|raw| raw.power_law(level)), raw.map(|raw| raw.constant_interval()));
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
    Ok(OrderFit { line, constant_interval, class, reason, points })
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
    for (i, reason) in excluded.iter_mut().enumerate().skip(floor) {
        if is_accidental(sorted, round_off, i) {
            reason.get_or_insert(Exclusion::RoundOffFloor);
        }
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

/// Whether the error at `i` is round-off between two that are far above it: an event fell on the end of a step by chance.
///
/// An error that changes its sign at random comes so close to zero once in a million points.
fn is_accidental(sorted: &[StepError], round_off: &[f64], i: usize) -> bool {
    let size = |i: usize| sorted[i].error.abs();
    let others = [i.checked_sub(1), (i + 1 < sorted.len()).then_some(i + 1)];
    size(i) <= ACCIDENT_HEIGHT * round_off[i]
        && others.into_iter().flatten().all(|other| size(other) > ACCIDENT_RATIO * size(i))
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
            (Class::Undecided, "the steps are too much alike to show a slope".to_owned())
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
    if negative.len() >= STEPS_MIN && alternates(negative) && line.is_regular() {
        let n = negative.len();
        return (Class::Oscillating, format!("the error changes sign from step to step, {n} points"));
    }
    if low > 0.0 {
        (Class::Converging, format!("the error falls as h^{slope:.2}"))
    } else if high < 0.0 {
        (Class::Diverging, format!("the error grows as h^{slope:.2} while the step shrinks"))
    } else {
        let sure = 100.0 * (1.0 - CLASS_LEVEL);
        (
            Class::Undecided,
            format!("slope {slope:.2} is not distinguished from zero: {sure} % within {low:.2} to {high:.2}"),
        )
    }
}

/// Scatter of logarithms about their line up to which the sizes of what alternates follow a power of the step, and that where two
/// degrees of freedom or fewer are left: few random sizes often lie near a line.
const REGULAR: f64 = 0.15;
const FEW_REGULAR: f64 = 0.02;

/// Slope of the logarithms `y` over `x` where they follow a line as those of an oscillation do.
pub(super) fn regular_slope(x: &[f64], y: &[f64]) -> Option<f64> {
    regression(x, y).filter(Line::is_regular).map(|line| line.slope)
}

/// Whether at least nine in ten neighbours differ in sign, at least three signs given.
///
/// Random signs do so in 1 of 8 tables of four points, and in 1 of 10¹⁰ of sixty: only sizes that are regular besides make
/// an oscillation.
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
    /// Whether the points follow the line as the sizes of an oscillation do.
    fn is_regular(&self) -> bool {
        self.scatter <= if self.dof > 2 { REGULAR } else { FEW_REGULAR }
    }

    fn slope_band(&self, level: f64) -> [f64; 2] {
        let half = (student_t(level, self.dof) * self.scatter / self.spread.sqrt()).max(ORDER_RESOLUTION);
        [self.slope - half, self.slope + half]
    }

    fn constant_interval(&self) -> [f64; 2] {
        let ([x, y], n) = (self.centre, (self.dof + 2) as f64);
        let half = student_t(0.05, self.dof) * self.scatter * (1.0 / n + x * x / self.spread).sqrt();
        [-half, half].map(|half| (y - self.slope * x + half).exp())
    }

    fn power_law(&self, level: f64) -> PowerLaw {
        let half = student_t(0.05, self.dof) * self.scatter / self.spread.sqrt();
        let [x, y] = self.centre;
        PowerLaw {
            order: self.slope,
            interval95: [self.slope - half, self.slope + half],
            verdict_band: self.slope_band(level),
            error_constant: (y - self.slope * x).exp(),
        }
    }
}

/// The law of the steps and errors `points`, none of them zero, without any exclusion.
pub(super) fn line_of(points: &[(f64, f64)], level: f64) -> Option<PowerLaw> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|(step, error)| (step.ln(), error.abs().ln())).unzip();
    Some(line(&x, &y)?.power_law(level))
}

/// `None` for fewer than [`STEPS_MIN`] points or fewer than two different x.
fn line(x: &[f64], y: &[f64]) -> Option<Line> {
    if x.len() < STEPS_MIN { None } else { regression(x, y) }
}

/// As [`line`], from three points on.
fn regression(x: &[f64], y: &[f64]) -> Option<Line> {
    let n = x.len();
    if n < 3 {
        return None;
    }
    let centre = [x.iter().sum::<f64>() / n as f64, y.iter().sum::<f64>() / n as f64];
    // About the means the two columns are orthogonal, so that the projections are the solution. A singular value
    // decomposition is no safer here: that of nalgebra 0.35 gives a wrong intercept, by up to 0.5, for one in
    // twenty such designs, because their columns are orthogonal but for rounding.
    let x = DVector::from_iterator(n, x.iter().map(|x| x - centre[0]));
    let y = DVector::from_iterator(n, y.iter().map(|y| y - centre[1]));
    let spread = x.norm_squared();
    // Steps that differ only in their last digits show no slope.
    if spread <= 1e-20 * n as f64 {
        return None;
    }
    let slope = x.dot(&y) / spread;
    let dof = n - 2;
    let scatter = ((y - slope * x).norm_squared() / dof as f64).sqrt();
    Some(Line { slope, centre, spread, scatter, dof })
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
    (dof as f64).sqrt() * bisect(0.0, FRAC_PI_2, 64, |theta| 1.0 - inside(theta, dof) > level).tan()
}

/// The end of the places that are `inside`, between one that is and one that is not, after `halvings`.
pub(super) fn bisect(within: f64, beyond: f64, halvings: u32, inside: impl Fn(f64) -> bool) -> f64 {
    let Ok(end) = try_bisect(within, beyond, halvings, |place| Ok::<_, Infallible>(inside(place)));
    end
}

/// As [`bisect`], where `inside` may have no answer.
pub(crate) fn try_bisect<E>(
    mut within: f64,
    mut beyond: f64,
    halvings: u32,
    inside: impl Fn(f64) -> Result<bool, E>,
) -> Result<f64, E> {
    for _ in 0..halvings {
        let middle = 0.5 * (within + beyond);
        *if inside(middle)? { &mut within } else { &mut beyond } = middle;
    }
    Ok(0.5 * (within + beyond))
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
mod tests;
