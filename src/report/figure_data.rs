//! What figures show beyond the evidence that claims keep: the paths of flights.

use crate::integrators::{ClosedForm, Detail, Flight, Integrator, Sample, Taylor};
use crate::physics::closed_form::state_at;
use crate::physics::{Problem, State};

/// Depths at which a path is told between two events.
const INTERVALS: u32 = 60;

/// The path of `problem` from impact to its end, dense enough to be drawn, and the flight with its events.
///
/// From the closed form; where there is none, every step of the Taylor series. `None` when neither flies it.
pub fn path_of(problem: &Problem) -> Option<(Vec<Sample>, Flight)> {
    if let Ok(flight) = ClosedForm.fly(problem, Detail::Events) {
        return Some((dense(problem, &flight)?, flight));
    }
    let flight = Taylor::default().fly(problem, Detail::Trajectory).ok()?;
    Some((flight.trajectory.clone(), flight))
}

/// Impact, parts of the way between events, and the events. Towards its end each way is told in ever shorter parts:
/// near rest little depth takes long.
fn dense(problem: &Problem, flight: &Flight) -> Option<Vec<Sample>> {
    let mut samples = Vec::new();
    let mut from = State::at_impact(problem);
    let mut stage = 0;
    let mut push = |state: State, stage: usize| {
        let force = problem.stages[stage].force(state.depth, state.velocity);
        samples.push(Sample { state, force, stage });
    };
    push(from, 0);
    for event in &flight.events {
        let to = event.state;
        for i in 1..INTERVALS {
            let left = 1.0 - f64::from(i) / f64::from(INTERVALS);
            let depth = from.depth + (to.depth - from.depth) * (1.0 - left * left);
            if depth > from.depth && depth < to.depth {
                push(state_at(problem, depth).ok()??, stage);
            }
        }
        push(to, stage);
        if stage < flight.stage && problem.stages[stage].end <= to.depth {
            stage += 1;
            // The force has two values where it jumps.
            push(to, stage);
        }
        from = to;
    }
    Some(samples)
}
