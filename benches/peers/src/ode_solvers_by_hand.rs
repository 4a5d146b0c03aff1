//! ode_solvers by hand: it knows no events, so a step that passes one stops the run, and the event is found by
//! integrating once more from the start of that step.

use std::cell::Cell;

use ode_solvers::{Dop853, Dopri5, OutputType, System, Vector2};

use crate::reduced::{Law, Node, Reduced, StageEnd, locate};

struct Run<'a> {
    stage: Reduced,
    /// The ends of the last step.
    step: &'a Cell<(Node, Node)>,
}

impl System<f64, Vector2<f64>> for Run<'_> {
    #[inline]
    fn system(&self, _t: f64, y: &Vector2<f64>, dy: &mut Vector2<f64>) {
        (dy[0], dy[1]) = (y[1], self.stage.law.rate(y[0], y[1]));
    }

    fn solout(&mut self, time: f64, y: &Vector2<f64>, _dy: &Vector2<f64>) -> bool {
        let after = Node { time, xi: y[0], u: y[1] };
        self.step.set((self.step.get().1, after));
        after.is_past(&self.stage) || !after.is_finite()
    }
}

struct Plain(Law);

impl System<f64, Vector2<f64>> for Plain {
    #[inline]
    fn system(&self, _t: f64, y: &Vector2<f64>, dy: &mut Vector2<f64>) {
        (dy[0], dy[1]) = (y[1], self.0.rate(y[0], y[1]));
    }
}

/// Longest time of a stage, in its own unit: no scene here takes longer.
const TIME_MAX: f64 = 1e6;

macro_rules! by_hand {
    ($name:ident, $solver:ident, $beta:expr, $least:expr, $largest:expr) => {
        #[doc = concat!("One stage by ", stringify!($solver), ".")]
        pub fn $name(stage: &Reduced, rtol: f64) -> Result<StageEnd, String> {
            let start = Node { time: 0.0, xi: 0.0, u: stage.speed };
            let step = Cell::new((start, start));
            let y = Vector2::new(0.0, stage.speed);
            let run = Run { stage: *stage, step: &step };
            let longest = stage.law.longest_step();
            let mut solver = $solver::from_param(
                run,
                0.0,
                TIME_MAX,
                0.0,
                y,
                rtol,
                rtol,
                0.9,
                $beta,
                $least,
                $largest,
                longest,
                0.0,
                1_000_000,
                1_000,
                OutputType::Sparse,
            );
            solver.integrate().map_err(|error| error.to_string())?;
            let (before, after) = step.get();
            if !after.is_finite() || !after.is_past(stage) {
                return Err("no event".to_owned());
            }
            locate(stage, before, after, |span| {
                let y = Vector2::new(before.xi, before.u);
                if span <= 0.0 {
                    return Ok(before);
                }
                let mut solver = $solver::from_param(
                    Plain(stage.law),
                    0.0,
                    span,
                    0.0,
                    y,
                    rtol,
                    rtol,
                    0.9,
                    $beta,
                    $least,
                    $largest,
                    span,
                    span,
                    1_000,
                    1_000,
                    OutputType::Sparse,
                );
                solver.integrate().map_err(|error| error.to_string())?;
                let y = solver.y_out().last().ok_or("no state")?;
                Ok(Node { time: before.time + span, xi: y[0], u: y[1] })
            })
        }
    };
}

by_hand!(dopri5, Dopri5, 0.04, 0.2, 10.0);
by_hand!(dop853, Dop853, 0.0, 0.333, 6.0);
