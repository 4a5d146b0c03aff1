//! Does everything hold at the edges? Checks of events, of step sizes and number range, and of the critical velocity.
//!
//! Their claims are those of `verification/edges.toml`. Each check builds scenes that no scene file should hold.
//! [`crate::studies::extreme_scenes`] does the same for random scenes by the million.

mod critical;
mod events;
mod steps;

use twofloat::TwoFloat;

use super::{Subject, off, solve, worst_of};
use crate::integrators::{Cost, Detail, Energy, Flight};
use crate::physics::reference::{self, Exact, ExactFlight, ExactState, Source};
use crate::physics::{Event, Outcome, Problem, Scene, Stage, State};
use crate::studies::edge_problems::slab;
use crate::suite::claim::{Found, Measurement, NotMeasured};

pub use self::{critical::*, events::*, steps::*};

impl Subject<'_> {
    /// Solution of `problem` at the method's default tolerance.
    pub(super) fn flight(&self, problem: &Problem) -> Found<Flight> {
        solve(&self.method(None)?, problem, Detail::Events)
    }

    /// The method's solution of `problem`, and the exact one of the same outcome.
    fn beside_exact(&self, problem: &Problem) -> Found<(Flight, Flight)> {
        let (flight, exact) = (self.flight(problem)?, exact(problem)?.values());
        holds!(flight.outcome.agrees_with(exact.outcome), "{} is {}", exact.outcome, flight.outcome);
        Ok((flight, exact))
    }

    /// The relative error that the method promises.
    pub(super) fn promise(&self) -> f64 {
        self.method_name().promise()
    }
}

/// Counts expectations, and states the first that fails.
#[derive(Debug, Default)]
pub(in crate::suite::checks) struct Violations {
    checks: usize,
    count: usize,
    first: Option<String>,
    notes: Vec<String>,
}

impl Violations {
    pub(in crate::suite::checks) fn expect(&mut self, holds: bool, what: impl FnOnce() -> String) {
        self.checks += 1;
        if !holds {
            self.count += 1;
            self.first.get_or_insert_with(what);
        }
    }

    pub(in crate::suite::checks) fn measurement(self) -> Measurement {
        let mut remark = format!("{} checks", self.checks);
        for note in self.notes.into_iter().chain(self.first.map(|first| format!("first violation: {first}"))) {
            remark = format!("{remark}; {note}");
        }
        // No check at all shows nothing.
        Measurement::new(if self.checks == 0 { f64::NAN } else { self.count as f64 }).remark(remark).cases(self.checks)
    }
}

/// What `check` counts.
pub(in crate::suite::checks) fn counted(check: impl FnOnce(&mut Violations) -> Found<()>) -> Found {
    let mut seen = Violations::default();
    check(&mut seen)?;
    Ok(seen.measurement())
}

/// The solution in 50 digits, by the recipe of the reference, which shares nothing with a method; with viscosity and drag
/// together, which it does not treat, in double-double by the energy formulation.
pub(super) fn exact(problem: &Problem) -> Found<Flight<TwoFloat>> {
    match reference::flight(Source::Problem(problem)) {
        Ok(exact) => Ok(in_double_double(&exact)),
        Err(_) => Ok(Energy::new().solve_in(&problem.cast::<TwoFloat>(), Detail::Events)?),
    }
}

fn in_double_double(exact: &ExactFlight) -> Flight<TwoFloat> {
    let number = |exact: &Exact| {
        let high = exact.to_f64();
        TwoFloat::from(high) - exact.error_over(high, &Exact::one())
    };
    let state = |state: &ExactState| State {
        time: number(&state.time),
        depth: number(&state.depth),
        velocity: number(&state.velocity),
    };
    Flight {
        outcome: exact.outcome,
        stage: exact.stage,
        end: state(&exact.end),
        events: exact.events.iter().map(|event| Event { kind: event.kind, state: state(&event.state) }).collect(),
        exit_margin: exact.exit_margin.as_ref().map(Exact::to_f64),
        exit_margin_error: None,
        cost: Cost::default(),
        trajectory: Vec::new(),
        step_limit: None,
        notes: Vec::new(),
    }
}

/// The exit margin of the exact solution: its sign is the outcome.
pub(super) fn exact_margin(problem: &Problem) -> Found<f64> {
    exact(problem)?.exit_margin.ok_or_else(|| NotMeasured::broken("the problem has no exit"))
}

/// Largest error of the end: depth and time relative to the exact ones, velocity to V0.
fn end_error(flight: &Flight, exact: &Flight, impact_speed: f64) -> f64 {
    worst_of([
        off(flight.end.depth, exact.end.depth),
        off(flight.end.time, exact.end.time),
        (flight.end.velocity - exact.end.velocity).abs() / impact_speed,
    ])
}

/// Whether `outcome` is right for a margin of that sign; `Undecided` is not wrong.
pub(super) fn is_right(outcome: Outcome, margin: f64) -> bool {
    match outcome {
        Outcome::Undecided => true,
        Outcome::Perforated => margin >= 0.0,
        _ => margin < 0.0,
    }
}

/// The slab without a far side, at 400 m/s: it comes to rest in the tunnel.
fn stop(drag: bool) -> Found<Problem> {
    Ok(Scene { thickness: None, ..slab(drag) }.resolve(400.0)?)
}

/// Crater (c, its end) and tunnel (P, Q) by their coefficients.
fn concrete(mass: f64, impact_speed: f64, crater: [f64; 2], tunnel: [f64; 2]) -> Problem {
    let (crater, tunnel) = (Stage::crater(crater[0], crater[1]), Stage::tunnel(tunnel[0], tunnel[1]));
    Problem::crater_and_tunnel(mass, impact_speed, Some(crater), tunnel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_without_expectations_shows_nothing() {
        assert!(Violations::default().measurement().value.is_nan());
        let mut one = Violations::default();
        one.expect(false, || "it is not so".to_owned());
        let measurement = one.measurement();
        assert!(measurement.value == 1.0 && measurement.remark.contains("it is not so"));
    }
}
