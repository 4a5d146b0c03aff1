//! The error of a quantity: depth and times relative to the exact value, velocities relative to V0 (contract, "Words").

use super::quantity::Quantity;
use crate::integrators::Flight;

/// Value of `quantity` at the end of `flight`; `None` for what the flight does not have.
///
/// The critical velocity is no quantity of one flight.
pub fn value_of(quantity: Quantity, flight: &Flight) -> Option<f64> {
    match quantity {
        Quantity::Depth => Some(flight.end.depth),
        Quantity::Time => Some(flight.end.time),
        Quantity::Velocity => Some(flight.end.velocity),
        Quantity::CraterEndTime => flight.crater_end().map(|s| s.time),
        Quantity::CraterEndVelocity => flight.crater_end().map(|s| s.velocity),
        Quantity::CriticalVelocity => None,
    }
}

/// Error with its sign of `value` against `exact`: over `exact`, or over `impact_speed` [m/s] for velocities of a flight.
///
/// Zero when both are the same number, also where the scale is zero.
pub fn signed_error(quantity: Quantity, value: f64, exact: f64, impact_speed: f64) -> f64 {
    let scale = match quantity {
        Quantity::Velocity | Quantity::CraterEndVelocity => impact_speed,
        Quantity::Depth | Quantity::Time | Quantity::CraterEndTime | Quantity::CriticalVelocity => exact,
    };
    if value == exact { 0.0 } else { (value - exact) / fault!("error-not-relative", scale, 1.0) }
}

/// Error with its sign of `quantity` of `flight` against `exact`; `None` where the outcomes differ, where either
/// flight lacks the quantity, or where the error is not a number.
pub fn flight_error(quantity: Quantity, flight: &Flight, exact: &Flight, impact_speed: f64) -> Option<f64> {
    if !flight.outcome.agrees_with(exact.outcome) {
        return None;
    }
    let (value, exact) = value_of(quantity, flight).zip(value_of(quantity, exact))?;
    Some(signed_error(quantity, value, exact, impact_speed)).filter(|e| e.is_finite())
}

/// Whether the scene fixes `quantity`: the depth of a perforation, the velocity at rest, a crater end not reached.
pub fn is_fixed(quantity: Quantity, exact: &Flight) -> bool {
    match quantity {
        Quantity::Depth => !exact.outcome.is_stop(),
        Quantity::Velocity => exact.outcome.is_stop(),
        Quantity::CraterEndTime | Quantity::CraterEndVelocity => exact.crater_end().is_none(),
        Quantity::Time => false,
        Quantity::CriticalVelocity => exact.exit_margin.is_none(),
    }
}
