//! The exact solution behind the interface of an integrator: nothing is integrated, no force is evaluated.
//!
//! [`crate::physics::closed_form`] has the formulas. A scene with a stage that has none on the way is refused.

use super::outcome::{Cost, Detail, Flight, IntegrationError, Integrator, Sample};
use crate::physics::closed_form::{self, ClosedFormError, Solution};
use crate::physics::{Outcome, Problem, State};

/// Depths at which a trajectory is told between two events.
const INTERVALS: u32 = 64;

/// The method `closed-form`.
///
/// Accurate to 8 ulp times condition number. Prefer it wherever it exists; it is what integrators are measured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClosedForm;

impl Integrator for ClosedForm {
    fn name(&self) -> &'static str {
        "closed-form"
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        if let Some(flight) = Flight::at_once(problem) {
            return Ok(flight);
        }
        let Solution { outcome, stage, end, events, exit_margin, exit_margin_error } =
            closed_form::solve(problem).map_err(IntegrationError::from)?;
        let trajectory = if detail == Detail::Trajectory { trajectory(problem, &events, end)? } else { Vec::new() };
        let inside_bar = match (exit_margin, exit_margin_error) {
            (Some(margin), Some(bar)) => margin.abs() <= bar,
            _ => false,
        };
        Ok(Flight {
            outcome: if inside_bar { Outcome::Undecided } else { outcome },
            stage,
            end,
            events: if detail == Detail::End { super::Events::new() } else { events },
            exit_margin,
            exit_margin_error,
            cost: Cost::default(),
            trajectory,
            step_limit: None,
            notes: Vec::new(),
        })
    }
}

impl From<ClosedFormError> for IntegrationError {
    fn from(error: ClosedFormError) -> Self {
        match error {
            ClosedFormError::NeverEnds { why, last } => Self::NeverEnds { why, last },
            ClosedFormError::OutOfRange { last, .. } => Self::NotFinite { what: "the closed form", last },
            error @ ClosedFormError::NoForm { .. } => {
                Self::Refused { method: "closed-form", why: format!("{error}; take an integrator, such as taylor") }
            }
        }
    }
}

/// Impact, [`INTERVALS`] equal parts of the way between events, and the events.
fn trajectory(
    problem: &Problem,
    events: &[crate::physics::Event],
    end: State,
) -> Result<Vec<Sample>, IntegrationError> {
    let mut samples = Vec::with_capacity((events.len() + 1) * INTERVALS as usize);
    let mut stage = 0;
    let mut push = |state: State| {
        // The last stage has no end.
        while problem.stages[stage].end <= state.depth && state.depth < end.depth {
            stage += 1;
        }
        samples.push(Sample { state, force: problem.stages[stage].force(state.depth, state.velocity), stage });
    };
    let mut from = State::at_impact(problem);
    push(from);
    for event in events {
        let to = event.state;
        if to.depth > from.depth {
            for i in 1..INTERVALS {
                let depth = from.depth + (to.depth - from.depth) * (f64::from(i) / f64::from(INTERVALS));
                // Between neighbouring floats there may be no depth in between.
                if depth > from.depth
                    && depth < to.depth
                    && let Some(state) = closed_form::state_at(problem, depth)?
                {
                    push(state);
                }
            }
            push(to);
        }
        from = to;
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]
    use super::*;
    use crate::physics::{EventKind, Stage, Target};

    fn perforating(impact_speed: f64) -> Problem {
        Problem {
            mass: 2.0,
            impact_speed,
            exit_depth: 0.3,
            stages: [Stage::crater(8.0e6, 0.1), Stage::tunnel(1e5, 1.0)].into_iter().collect(),
            crater: Some(0),
            target: Target::CraterAndTunnel,
        }
    }

    #[test]
    fn costs_nothing_and_tells_every_event() {
        let flight = ClosedForm.fly(&perforating(400.0), Detail::Events).unwrap();
        assert_eq!(flight.cost, Cost::default());
        assert_eq!(flight.outcome, Outcome::Perforated);
        let kinds: Vec<_> = flight.events.iter().map(|e| e.kind).collect();
        assert_eq!(kinds, [EventKind::CraterEnd, EventKind::Exit]);
        assert!(ClosedForm.fly(&perforating(400.0), Detail::End).unwrap().events.is_empty());
    }

    #[test]
    fn within_round_off_of_the_critical_velocity_it_is_undecided_and_just_outside_it_is_not() {
        let critical = closed_form::critical_of_stages(&perforating(1.0)).unwrap().velocity;
        let outcome = |factor: f64| ClosedForm.fly(&perforating(critical * factor), Detail::End).unwrap().outcome;
        assert_eq!(outcome(1.0), Outcome::Undecided);
        assert_eq!(outcome(1.0 + 1e-13), Outcome::Perforated);
        assert_eq!(outcome(1.0 - 1e-13), Outcome::StoppedInTunnel);
    }

    #[test]
    fn a_stage_without_a_form_is_refused_and_a_flight_without_an_end_is_not_a_mistake_of_the_caller() {
        let mut problem = perforating(400.0);
        problem.stages[0].drag = 1.0;
        let refused = ClosedForm.fly(&problem, Detail::End).unwrap_err();
        assert!(refused.is_usage(), "{refused}");
        assert!(refused.to_string().starts_with("closed-form cannot treat this scene: stage 0 has no closed form"));
        problem = perforating(400.0);
        (problem.exit_depth, problem.stages[1].static_force) = (f64::INFINITY, 0.0);
        let endless = ClosedForm.fly(&problem, Detail::End).unwrap_err();
        assert!(matches!(endless, IntegrationError::NeverEnds { .. }), "{endless}");
        assert_eq!(endless.last().unwrap().depth, 0.1);
    }

    #[test]
    fn a_trajectory_rises_in_time_and_depth_and_gives_the_force_of_the_stage_ahead() {
        let problem = perforating(400.0);
        let samples = ClosedForm.fly(&problem, Detail::Trajectory).unwrap().trajectory;
        assert_eq!(samples.len(), 2 * INTERVALS as usize + 1);
        assert!(samples.windows(2).all(|w| w[0].state.time < w[1].state.time && w[0].state.depth < w[1].state.depth));
        let boundary = samples[INTERVALS as usize];
        assert_eq!((boundary.state.depth, boundary.stage), (0.1, 1));
        assert_eq!(boundary.force, 1e5 + boundary.state.velocity.powi(2));
        assert_eq!(samples.last().unwrap().state.depth, 0.3);
    }

    #[test]
    fn a_trajectory_gives_no_depth_twice_and_stays_at_its_end_in_the_stage_it_ended_in() {
        assert_eq!(ClosedForm.name(), "closed-form");
        let stages = [
            Stage::crater(8.0e6, 0.1),
            Stage { end: 0.1, ..Stage::tunnel(3e5, 0.0) },
            Stage { end: 0.2, ..Stage::tunnel(1e5, 1.0) },
            Stage::tunnel(2e5, 0.0),
        ];
        let next = 0.1_f64.next_up();
        // Exits at a stage end, behind it, one spacing behind it, and where two stages end.
        for (exit_depth, last) in [(0.2, 2), (0.3, 3), (next, 2), (0.1, 0)] {
            let problem = Problem { stages: stages.into_iter().collect(), exit_depth, ..perforating(400.0) };
            let samples = ClosedForm.fly(&problem, Detail::Trajectory).unwrap().trajectory;
            assert!(samples.windows(2).all(|w| w[0].state.depth < w[1].state.depth), "{exit_depth}");
            for sample in &samples {
                let State { depth, velocity, .. } = sample.state;
                let stage = match depth {
                    x if x == exit_depth => last,
                    x if x < 0.1 => 0,
                    x if x < 0.2 => 2,
                    _ => 3,
                };
                assert_eq!(sample.stage, stage, "{depth} of {exit_depth}");
                assert_eq!(sample.force, stages[stage].force(depth, velocity));
            }
        }
    }
}
