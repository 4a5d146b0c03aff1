//! How many digits does rounding take? The same kernels in f32, f64 and double-double, and the floor over the steps.
//!
//! A kernel run twice on the same inputs, once in a finer number type, differs by rounding alone: truncation and event
//! rules are the same in both. Digits lost are `log10(error/epsilon)` of the coarser type, errors as everywhere
//! (depth and times relative, velocities to V0).

use twofloat::TwoFloat;

use super::error::{signed_error, value_of};
use super::quantity::Quantity;
use crate::integrators::central_difference::{Boundaries, CentralDifference, Summation, VelocityAt};
use crate::integrators::{Detail, Energy, Flight, IntegrationError, MethodName, Taylor};
use crate::physics::{Problem, Scalar, State};

/// Digits that one kernel loses in one number type, per quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct DigitsLost {
    /// Kernel.
    pub method: MethodName,
    /// Number type.
    pub number: &'static str,
    /// Rounding unit of the type.
    pub epsilon: f64,
    /// Decimal digits lost of each quantity; zero where the error is below the rounding unit.
    pub lost: Vec<(Quantity, f64)>,
}

/// Solves `problem` by `method` in `S`; the central difference lagged and located, with steps of `dt` (s).
fn solve<S: Scalar>(method: MethodName, problem: &Problem, dt: f64) -> Result<Flight<S>, IntegrationError> {
    let problem = problem.cast::<S>();
    match method {
        MethodName::Energy => Energy::new().solve_in(&problem, Detail::Events),
        MethodName::CentralDifference => {
            CentralDifference::uniform(dt, VelocityAt::LaggedHalfStep, Boundaries::Interpolated)
                .solve_in(&problem, Detail::Events)
        }
        _ => Taylor::default().solve_in(&problem, Detail::Events),
    }
}

/// Digits lost by the kernels of Taylor series, energy and central difference in f32 and f64, against double-double.
///
/// f32 is measured on the inputs as f32 rounds them, so that their rounding is not counted.
///
/// # Errors
/// [`IntegrationError`] of a kernel.
pub fn digits_lost(problem: &Problem, dt: f64) -> Result<Vec<DigitsLost>, IntegrationError> {
    let coarse = problem.cast::<f32>().cast::<f64>();
    let coarse_dt = f64::from(dt as f32);
    let mut rows = Vec::new();
    for method in [MethodName::Taylor, MethodName::Energy, MethodName::CentralDifference] {
        let row = |number, epsilon, found: Flight, exact: Flight<TwoFloat>| DigitsLost {
            method,
            number,
            epsilon,
            lost: digits(&found, &exact.values(), problem.impact_speed, epsilon),
        };
        let single = solve::<f32>(method, &coarse, coarse_dt)?.values();
        rows.push(row("f32", f64::from(f32::EPSILON), single, solve(method, &coarse, coarse_dt)?));
        rows.push(row("f64", f64::EPSILON, solve::<f64>(method, problem, dt)?, solve(method, problem, dt)?));
    }
    Ok(rows)
}

/// Digits lost of what both flights have.
fn digits(found: &Flight, exact: &Flight, speed: f64, epsilon: f64) -> Vec<(Quantity, f64)> {
    let lost = |quantity| {
        let (value, exact) = value_of(quantity, found).zip(value_of(quantity, exact))?;
        let error = signed_error(quantity, value, exact, speed).abs();
        Some((quantity, (error / epsilon).log10().max(0.0)))
    };
    Quantity::OF_A_FLIGHT.into_iter().filter_map(lost).collect()
}

/// Errors of the depth by the central difference after so many steps, relative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Steps to the end of the flight.
    pub steps: f64,
    /// Time step (s).
    pub dt: f64,
    /// Truncation error of the depth, in double-double: what the floor rises against. `None` beyond the steps for which
    /// double-double is fast enough.
    pub truncation: Option<f64>,
    /// In f64 with plain sums.
    pub plain: Errors,
    /// In f64 with compensated sums.
    pub compensated: Errors,
    /// In f32 with plain sums, on the inputs as f32 rounds them.
    pub single: Errors,
    /// In f32 with compensated sums.
    pub single_compensated: Errors,
}

/// Relative errors of one depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Against the same steps in double-double: rounding alone; `None` where those were not taken.
    pub rounding: Option<f64>,
    /// Against the exact depth: truncation and rounding.
    pub total: f64,
}

/// Error of the depth of `problem` against the number of steps, from 2^`from` to 2^`to`, centred and landed: truncation
/// (double-double against the exact depth) falls, rounding (f64 and f32 against double-double) rises.
///
/// Beyond 2^`split` steps double-double and every other row are left out: they take most of the time, and the truncation of
/// double-double goes on as it began.
///
/// # Errors
/// [`IntegrationError`] of a flight.
pub fn floor(problem: &Problem, from: u32, split: u32, to: u32) -> Result<Vec<Floor>, IntegrationError> {
    let single = problem.cast::<f32>();
    let (exact, wide) = (exact_end(problem)?, problem.cast::<TwoFloat>());
    let (single_exact, single_wide) = (exact_end(&single.cast())?, single.cast::<TwoFloat>());
    (from..=split)
        .chain((split + 2..=to).step_by(2))
        .map(|power| {
            let steps = 2f64.powi(power.cast_signed());
            let dt = exact.time.value() / steps;
            let single_dt = f64::from(dt as f32);
            let by_double_double =
                |problem, dt| (power <= split).then(|| depth_after(problem, dt, Summation::Plain)).transpose();
            let (fine, single_fine) = (by_double_double(&wide, dt)?, by_double_double(&single_wide, single_dt)?);
            let in_double = |summation| -> Result<Errors, IntegrationError> {
                Ok(Errors::of(depth_after(problem, dt, summation)?.into(), fine, exact.depth))
            };
            let in_single = |summation| -> Result<Errors, IntegrationError> {
                let found = f64::from(depth_after(&single, single_dt, summation)?);
                Ok(Errors::of(found.into(), single_fine, single_exact.depth))
            };
            Ok(Floor {
                steps,
                dt,
                truncation: fine.map(|fine| off(fine, exact.depth)),
                plain: in_double(Summation::Plain)?,
                compensated: in_double(Summation::Compensated)?,
                single: in_single(Summation::Plain)?,
                single_compensated: in_single(Summation::Compensated)?,
            })
        })
        .collect()
}

/// Depth (m) at the end of `problem` by steps of `dt` (s), centred and landed.
fn depth_after<S: Scalar>(problem: &Problem<S>, dt: f64, summation: Summation) -> Result<S, IntegrationError> {
    let scheme = CentralDifference::uniform(dt, VelocityAt::Centred, Boundaries::Landed);
    Ok(CentralDifference { summation, ..scheme }.solve_in(problem, Detail::End)?.end.depth)
}

impl Errors {
    fn of(found: TwoFloat, fine: Option<TwoFloat>, exact: TwoFloat) -> Self {
        Self { rounding: fine.map(|fine| off(found, fine)), total: off(found, exact) }
    }
}

/// Relative distance of `found` from `right`.
fn off(found: TwoFloat, right: TwoFloat) -> f64 {
    ((found - right).value() / right.value()).abs()
}

/// The end of `problem` in double-double.
fn exact_end(problem: &Problem) -> Result<State<TwoFloat>, IntegrationError> {
    Ok(Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::End)?.end)
}

/// Slope of `ln error` over `ln steps` by least squares; errors of zero are left out. NaN with fewer than two points.
pub fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let logs: Vec<(f64, f64)> = points.filter(|(_, e)| *e > 0.0).map(|(x, e)| (x.ln(), e.ln())).collect();
    let n = logs.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| logs.iter().map(pick).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let covariance: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let variance: f64 = logs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum();
    covariance / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_power_law_is_its_power() {
        let points = (1..9).map(|n| (f64::from(n), 3.0 * f64::from(n).powf(-1.5)));
        assert!((slope(points) + 1.5).abs() < 1e-12);
        assert!(slope([(1.0, 1.0)].into_iter()).is_nan());
    }
}
