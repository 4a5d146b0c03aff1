//! The exact solution as one more method: nothing is integrated, no force is evaluated.
//!
//! [`crate::physics::closed_form`] has the formulas of one stage. A scene that enters a stage without one is refused.

use super::flight::{self, Bounded, Course, StageEnd, StageSolver};
use super::outcome::{Detail, Flight, IntegrationError, Integrator, Sample, Solved, refuse_laws};
use crate::physics::closed_form::{Line, cross, cross_continuous_crater, margin_error};
use crate::physics::{CraterStiffness, Law, Problem, Stage, State};

/// Bound on the places tried for a time; halving alone takes 53, and the parabola three or four.
const PLACE_STEPS_MAX: u32 = 80;

/// Roundings of V² and of the work over the depth in one piece of a table of velocity.
const ROUNDINGS_OF_PIECE: f64 = 8.0;

/// Parts of the distance between two events in a trajectory.
const INTERVALS: u32 = 64;

/// The method `closed-form`.
///
/// Accurate to 8 ulp times condition number. Prefer it where it exists; integrators are measured against it.
///
/// # Example
/// ```
/// use penetrode::integrators::{ClosedForm, Detail, Integrator};
/// use penetrode::physics::{Outcome, Problem, Stage};
/// // 100 N against 1 kg at 10 m/s: V0²/(2 a) = 0.5 m in V0/a = 0.1 s.
/// let problem = Problem::crater_and_tunnel(1.0, 10.0, None, Stage::tunnel(100.0, 0.0));
/// let flight = ClosedForm.solve(&problem, Detail::End)?;
/// assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
/// assert_eq!((flight.end.depth, flight.end.time), (0.5, 0.1));
/// # Ok::<(), penetrode::integrators::IntegrationError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClosedForm;

impl Integrator for ClosedForm {
    fn name(&self) -> &'static str {
        "closed-form"
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        refuse(problem)?;
        if matches!(detail, Detail::Trajectory) {
            return with_trajectory(problem);
        }
        flight::solve(problem, detail, &mut Exact { continuous: false })
    }

    fn explain(&self, _problem: &Problem, flight: &Flight) -> Vec<String> {
        // A flight that is over at impact has said so.
        if flight.notes.is_empty() { vec!["no integration: the closed form".to_owned()] } else { Vec::new() }
    }
}

/// The flight, and its path.
#[cold]
fn with_trajectory(problem: &Problem) -> Solved {
    let mut flight = ClosedForm.solve(problem, Detail::Events)?;
    if flight.end.time > 0.0 {
        flight.trajectory = path(problem, &flight, INTERVALS, |share| share)?;
        // One sample a place, with the force of the stage ahead.
        flight.trajectory.dedup_by(|next, last| {
            let is_same_place = next.state.depth == last.state.depth;
            if is_same_place {
                *last = *next;
            }
            is_same_place
        });
    }
    Ok(flight)
}

/// Solves crater and tunnel whose crater constant was chosen by `stiffness`.
///
/// The same solution as [`ClosedForm`], except that the speed in a continuous crater is computed without c:
///
/// ```text
/// V(x)² = (V0² (k d M + Q (k d - x)(k d + x)) - x² P)/(k d (M + k d Q))
/// ```
///
/// The rounding of c alone moves V1 by up to `sqrt(1 + k d Q/M)/4` ulps of V0: nothing for N above one, 14 ulps at
/// N = 1e-3. This form has no such loss.
///
/// # Errors
/// As [`ClosedForm`].
pub fn solve_crater_and_tunnel(problem: &Problem, stiffness: CraterStiffness) -> Solved {
    refuse_laws(problem, ClosedForm.name())?;
    let continuous = stiffness == CraterStiffness::Continuous;
    flight::solve(problem, Detail::Events, &mut Exact { continuous })
}

/// The state in which the projectile passes `depth` (m), rest there included; `None` if it does not get there.
///
/// Depths beyond the exit depth are not reached. The path V(x), t(x) of the exact solution.
///
/// # Errors
/// As [`ClosedForm`], for the stages up to `depth` only.
pub fn state_at(problem: &Problem, depth: f64) -> Solved<Option<State>> {
    if !(0.0..=problem.exit_depth).contains(&depth) || depth.is_infinite() {
        return Ok(None);
    }
    refuse(problem)?;
    let end = flight::solve(&problem.clone().with_exit(depth), Detail::End, &mut Exact { continuous: false })?.end;
    Ok((end.depth == depth).then_some(end))
}

/// Refuses a problem with a law of its own that is no table of velocity.
fn refuse(problem: &Problem) -> Solved<()> {
    let has_form = |index: usize| {
        let law = problem.laws.of(index);
        law.is_none_or(|law| law.table().is_some() && law.joining(0.0).is_none())
    };
    if problem.laws.is_empty() || (0..problem.stages.len()).all(has_form) {
        Ok(())
    } else {
        refuse_laws(problem, ClosedForm.name())
    }
}

/// The formulas, stage by stage.
struct Exact {
    /// The crater constant is the continuous one, and the speed in the crater is computed without it.
    continuous: bool,
}

impl StageSolver<f64> for Exact {
    // A call here has the state stored in halves and loaded whole: a stall of 30 ns, a third of a flight.
    #[inline(always)]
    fn solve_stage(&mut self, course: &mut Course<'_>) -> Solved<StageEnd> {
        let (problem, stage, entry) = (course.problem, course.stage, course.state);
        let limit = problem.limit_of(stage);
        if let Some(line) = course.law().and_then(Law::line) {
            course.limit()?;
            return cross_piece(course, &line, limit);
        }
        let end = if self.continuous && problem.crater == Some(stage) {
            cross_continuous_crater(problem, limit)
        } else {
            cross(&problem.stages[stage], problem.mass, entry, limit).map_err(|why| IntegrationError::Refused {
                method: "closed-form",
                why: format!("stage {stage} has no closed form: {why}; take an integrator, such as taylor"),
            })?
        };
        if let StageEnd::Approach(..) = end {
            course.error_bound = margin_error(problem, stage, entry.depth, 0.0);
        }
        let state = end.state();
        if state.is_finite() {
            if !self.continuous {
                course.sample_until(state, |time| state_in(&problem.stages[stage], problem.mass, entry, state, time));
            }
            Ok(end)
        } else {
            Err(IntegrationError::NotFinite { what: "the closed form", last: entry })
        }
    }

    fn margin(&mut self, course: &mut Course<'_>) -> Solved<Bounded> {
        if !course.problem.laws.is_empty() {
            return Ok(course.margin());
        }
        let value = course.margin().value;
        Ok(Bounded { value, bound: margin_error(course.problem, course.stage, course.state.depth, value) })
    }
}

/// A piece of a table of velocity, from the state of `course` to `limit`.
fn cross_piece(course: &mut Course<'_>, line: &Line, limit: f64) -> Solved<StageEnd> {
    let (entry, mass) = (course.state, course.mass);
    let end = line.cross(mass, entry, limit);
    let state = end.state();
    if !state.is_finite() {
        return Err(IntegrationError::NotFinite { what: "the closed form", last: entry });
    }
    course.sample_until(state, |time| line.after(mass, entry, time - entry.time));
    // Of W, by roundings of V and of the depth; it grows and falls as the force does.
    let forces = [entry.velocity, state.velocity].map(|v| line.force(v).abs());
    let fastest = entry.velocity.max(state.velocity);
    let growth = (-line.slope / mass * (state.time - entry.time)).exp();
    let added = ROUNDINGS_OF_PIECE * (fastest * fastest + 2.0 * forces[0].max(forces[1]) * state.depth / mass);
    let relative = 1.0 / course.problem.impact_speed;
    course.error_bound = course.error_bound * growth + f64::EPSILON * relative * relative * added;
    Ok(end)
}

/// The state at `time` (s) between `entry` and `end` to `end` through `law`: the place is sought whose formulas give that time.
fn state_in(law: &Stage, mass: f64, entry: State, end: State, time: f64) -> State {
    let (mut low, mut high) = (entry, end);
    let mut here = entry;
    // From a state that is near, the parabola of a constant force goes the rest.
    let along = |from: State| {
        let (left, acceleration) = (time - from.time, -law.force(from.depth, from.velocity) / mass);
        let depth = from.depth + left * (from.velocity + 0.5 * left * acceleration);
        State { time, depth, velocity: from.velocity + left * acceleration }
    };
    for _ in 0..PLACE_STEPS_MAX {
        let guess = along(here).depth;
        let depth = if guess > low.depth && guess < high.depth { guess } else { 0.5 * (low.depth + high.depth) };
        // Between neighbouring floats there may be no depth in between.
        if depth <= low.depth || depth >= high.depth {
            break;
        }
        let Ok(StageEnd::Limit(state) | StageEnd::Rest(state)) = cross(law, mass, entry, depth) else { break };
        here = state;
        *if here.time > time { &mut high } else { &mut low } = here;
        if (here.time - time).abs() <= f64::EPSILON * time {
            break;
        }
    }
    along(here)
}

/// The path of `flight` through `problem`: impact, `intervals` parts of the distance between events, and the events.
///
/// `place` maps a share of the parts, 0 to 1, to a share of the distance. Where the force jumps, both values are
/// listed.
///
/// # Errors
/// As [`ClosedForm`].
pub fn path(problem: &Problem, flight: &Flight, intervals: u32, place: impl Fn(f64) -> f64) -> Solved<Vec<Sample>> {
    let sample = |state: State, stage: usize| {
        let force = problem.force(stage, state.depth, state.velocity);
        Sample { state, force, stage }
    };
    let mut from = State::at_impact(problem);
    let mut stage = 0;
    let mut samples = vec![sample(from, stage)];
    for event in &flight.events {
        let to = event.state;
        for i in 1..intervals {
            let depth = from.depth + (to.depth - from.depth) * place(f64::from(i) / f64::from(intervals));
            // Between neighbouring floats there may be no depth in between.
            if depth > from.depth
                && depth < to.depth
                && let Some(state) = state_at(problem, depth)?
            {
                samples.push(sample(state, stage));
            }
        }
        samples.push(sample(to, stage));
        if stage < flight.stage && problem.stages[stage].end <= to.depth {
            stage += 1;
            samples.push(sample(to, stage));
        }
        from = to;
    }
    Ok(samples)
}

#[cfg(test)]
mod tests;
