//! differential-equations by hand: its own events are located to 1e-3 at worst (on a dense output of low order), so its
//! steps are watched from a solout, and an event is found by integrating once more from the start of its step.

use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::ode::solve_ode;
use differential_equations::prelude::{ControlFlag, Interpolation, ODE, Solout, Solution};

use crate::reduced::{Law, Node, Reduced, StageEnd, locate};

struct Motion(Law);

impl ODE<f64, [f64; 2]> for Motion {
    #[inline]
    fn diff(&self, _t: f64, y: &[f64; 2], dy: &mut [f64; 2]) {
        *dy = [y[1], self.0.rate(y[0], y[1])];
    }
}

/// Stops at the first step that passes an event.
struct Watch {
    stage: Reduced,
    step: (Node, Node),
}

impl Solout<f64, [f64; 2]> for Watch {
    fn solout<I>(
        &mut self,
        time: f64,
        time_before: f64,
        y: &[f64; 2],
        y_before: &[f64; 2],
        _interpolator: &mut I,
        _solution: &mut Solution<f64, [f64; 2]>,
    ) -> ControlFlag<f64, [f64; 2]>
    where
        I: Interpolation<f64, [f64; 2]> + ?Sized,
    {
        let node = |time, y: &[f64; 2]| Node { time, xi: y[0], u: y[1] };
        self.step = (node(time_before, y_before), node(time, y));
        let after = self.step.1;
        if after.is_past(&self.stage) || !after.is_finite() { ControlFlag::Terminate } else { ControlFlag::Continue }
    }
}

/// Keeps the last state.
struct Last([f64; 2]);

impl Solout<f64, [f64; 2]> for Last {
    fn solout<I>(
        &mut self,
        _time: f64,
        _time_before: f64,
        y: &[f64; 2],
        _y_before: &[f64; 2],
        _interpolator: &mut I,
        _solution: &mut Solution<f64, [f64; 2]>,
    ) -> ControlFlag<f64, [f64; 2]>
    where
        I: Interpolation<f64, [f64; 2]> + ?Sized,
    {
        self.0 = *y;
        ControlFlag::Continue
    }
}

macro_rules! by_hand {
    ($name:ident) => {
        #[doc = concat!("One stage by ", stringify!($name), ".")]
        pub fn $name(stage: &Reduced, rtol: f64) -> Result<StageEnd, String> {
            let start = Node { time: 0.0, xi: 0.0, u: stage.speed };
            let mut watch = Watch { stage: *stage, step: (start, start) };
            let longest = stage.law.longest_step();
            let mut method =
                ExplicitRungeKutta::$name().rtol(rtol).atol(rtol).h_max(longest).max_steps(1_000_000).h_min(0.0);
            solve_ode(&mut method, &Motion(stage.law), 0.0, 1e6, &[0.0, stage.speed], &mut watch)
                .map_err(|error| format!("{error:?}"))?;
            let (before, after) = watch.step;
            if !after.is_finite() || !after.is_past(stage) {
                return Err("no event".to_owned());
            }
            locate(stage, before, after, |span| {
                if span <= 0.0 {
                    return Ok(before);
                }
                let mut last = Last([before.xi, before.u]);
                let mut method = ExplicitRungeKutta::$name().rtol(rtol).atol(rtol).h0(span).h_min(0.0);
                solve_ode(&mut method, &Motion(stage.law), 0.0, span, &[before.xi, before.u], &mut last)
                    .map_err(|error| format!("{error:?}"))?;
                Ok(Node { time: before.time + span, xi: last.0[0], u: last.0[1] })
            })
        }
    };
}

by_hand!(dopri5);
by_hand!(dop853);
