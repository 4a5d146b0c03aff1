//! An integrator of your own beside the closed form: `cargo run --example own_integrator`.
//!
//! The classical Runge-Kutta method over depth instead of time, for projectiles that get through:
//!
//! ```text
//! d(V²)/dx = -2 F(x, V)/M,   dt/dx = 1/V
//! ```

use std::error::Error;

use penetrode::integrators::{Cost, Events};
use penetrode::physics::{Event, EventKind};
use penetrode::{
    ClosedForm, Detail, Flight, IntegrationError, Integrator, Outcome, Problem, Stage, State, StepError, fit_order,
};

/// Runge-Kutta of order 4 in x, with the same number of steps in each stage.
struct OverDepth {
    steps: u32,
}

impl Integrator for OverDepth {
    fn name(&self) -> &'static str {
        "over-depth"
    }

    fn order(&self) -> Option<u32> {
        Some(4)
    }

    fn solve(&self, problem: &Problem, _: Detail) -> Result<Flight, IntegrationError> {
        let refused = || IntegrationError::Refused {
            method: self.name(),
            why: "it needs a far side, and a projectile that reaches it".to_owned(),
        };
        let mut state = State::at_impact(problem);
        let mut events = Events::new();
        let mut index = 0;
        // Restarted at each stage end: across a jump of the force no scheme keeps its order.
        loop {
            let (stage, limit) = (&problem.stages[index], problem.limit_of(index));
            let h = (limit - state.depth) / f64::from(self.steps);
            if !limit.is_finite() {
                return Err(refused());
            }
            let rates = |x: f64, w: f64| (1.0 / w.sqrt(), -2.0 * stage.force(x, w.sqrt()) / problem.mass);
            let (mut t, mut w) = (state.time, state.velocity.powi(2));
            for step in 0..self.steps {
                let x = state.depth + f64::from(step) * h;
                let k1 = rates(x, w);
                let k2 = rates(x + 0.5 * h, w + 0.5 * h * k1.1);
                let k3 = rates(x + 0.5 * h, w + 0.5 * h * k2.1);
                let k4 = rates(x + h, w + h * k3.1);
                t += h / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
                w += h / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
            }
            // Not above zero, or NaN: at rest before the boundary.
            if !(w > 0.0 && t.is_finite()) {
                return Err(refused());
            }
            state = State { time: t, depth: limit, velocity: w.sqrt() };
            if stage.end <= problem.exit_depth {
                events.push(Event { kind: EventKind::boundary(problem, index), state });
            }
            if limit == problem.exit_depth {
                break;
            }
            index += 1;
        }
        events.push(Event { kind: EventKind::Exit, state });
        let steps = u64::from(self.steps) * (index as u64 + 1);
        Ok(Flight {
            outcome: Outcome::Perforated,
            stage: index,
            end: state,
            events,
            exit_margin: Some((state.velocity / problem.impact_speed).powi(2)),
            exit_margin_error: None,
            cost: Cost { steps, rejected_steps: 0, force_evaluations: 4 * steps },
            trajectory: Vec::new(),
            step_limit: None,
            notes: Vec::new(),
        })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // 2 kg at 400 m/s through a spring of 100 mm and a tunnel of constant force and drag, 180 mm in all.
    let spring = Stage::crater(5.0e6, 0.1);
    let tunnel = Stage::tunnel(4.0e5, 3.0);
    let problem = Problem { exit_depth: 0.18, ..Problem::of_stages(2.0, 400.0, [spring, tunnel]) };
    let exact = ClosedForm.solve(&problem, Detail::Events)?.end;
    println!("closed form: {exact}\n\nsteps  error of V/V0  error of t");
    let mut errors = Vec::new();
    for steps in [3, 5, 8, 13, 21, 34] {
        let end = OverDepth { steps }.solve(&problem, Detail::End)?.end;
        let error = (end.velocity - exact.velocity) / problem.impact_speed;
        println!("{steps:>5}  {error:>13.1e}  {:>10.1e}", end.time / exact.time - 1.0);
        errors.push(StepError::new(1.0 / f64::from(steps), error));
    }
    let fit = fit_order(&errors)?;
    println!("\n{} ({}): order 4 is {:?}", fit.class.name(), fit.reason, fit.verdict(4.0));
    Ok(())
}
