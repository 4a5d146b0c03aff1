//! The order of convergence of a scheme of your own: `cargo run --example order_study`.
//!
//! In the crater the projectile is on a spring, `M dV/dt = -c x`, so `V = V0 cos(w t)` with `w = sqrt(c/M)`. Two
//! schemes integrate it to a fixed time; both are called leapfrog, and one of them starts wrongly.

use std::error::Error;

use penetrode::{StepError, fit_order};

const SPEED: f64 = 300.0;
const FREQUENCY: f64 = 2000.0;
const TIME: f64 = 5e-4;

/// Velocity at [`TIME`] after `steps` steps; V is first moved by `first` of a step, then stands half a step beside x.
fn leapfrog(steps: u32, first: f64) -> f64 {
    let dt = TIME / f64::from(steps);
    let acceleration = |x: f64| -FREQUENCY * FREQUENCY * x;
    let mut x = 0.0;
    let mut v = SPEED + first * dt * acceleration(x);
    for step in 1..=steps {
        x += v * dt;
        // The last half step brings V back to the time of x.
        v += if step == steps { 1.0 - first } else { 1.0 } * dt * acceleration(x);
    }
    v
}

fn main() -> Result<(), Box<dyn Error>> {
    let exact = SPEED * (FREQUENCY * TIME).cos();
    for (name, first, formal) in [("half a step apart", 0.5, 2.0), ("V not shifted", 0.0, 2.0)] {
        // Steps that are no multiples of one another: an error that vanishes at one size is then seen at the next.
        let points: Vec<_> = [10, 17, 29, 50, 86, 149, 257, 443]
            .map(|steps| StepError::new(TIME / f64::from(steps), leapfrog(steps, first) / exact - 1.0))
            .into();
        let fit = fit_order(&points)?;
        println!("{name}: {} ({})", fit.class.name(), fit.reason);
        if let Some(line) = fit.line {
            let [low, high] = line.interval95;
            println!("  order {:.4}, 95 % interval {low:.4} to {high:.4}", line.order);
        }
        println!("  of order {formal}: {:?}\n", fit.verdict(formal));
    }
    Ok(())
}
