//! What do figures show beyond the evidence of the claims? The paths of flights.

use crate::integrators::closed_form::path;
use crate::integrators::{ClosedForm, Detail, Flight, Integrator, Sample, Taylor};
use crate::physics::Problem;

/// Parts of the path between two events.
const INTERVALS: u32 = 60;

/// The path of `problem` from impact to its end, dense enough to be drawn, and the flight with its events.
///
/// From the closed form; where there is none, every step of the Taylor series. `None` where neither has a solution.
///
/// The parts become shorter towards an event: near rest little depth takes long.
pub fn path_of(problem: &Problem) -> Option<(Vec<Sample>, Flight)> {
    if let Ok(flight) = ClosedForm.solve(problem, Detail::Events) {
        let towards_the_end = |share: f64| 1.0 - (1.0 - share) * (1.0 - share);
        return Some((path(problem, &flight, INTERVALS, towards_the_end).ok()?, flight));
    }
    let flight = Taylor::default().solve(problem, Detail::Trajectory).ok()?;
    Some((flight.trajectory.clone(), flight))
}
