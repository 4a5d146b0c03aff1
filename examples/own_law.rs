//! A force of your own in code: `cargo run --example own_law`.
//!
//! A force measured at some velocities, linear between them: `F = f(V)`.

use std::error::Error;
use std::sync::Arc;

use penetrode::integrators::Diffsol;
use penetrode::physics::{ForceFunction, Law};
use penetrode::studies::critical_velocity::critical_velocity;
use penetrode::{Detail, Integrator, Problem, Stage};

/// Rows of velocity (m/s) and force (N).
#[derive(Debug)]
struct Measured(Vec<(f64, f64)>);

impl ForceFunction for Measured {
    fn force(&self, _x: f64, v: f64) -> f64 {
        let behind = self.0.partition_point(|row| row.0 <= v).clamp(1, self.0.len() - 1);
        let ((v1, f1), (v2, f2)) = (self.0[behind - 1], self.0[behind]);
        f1 + (f2 - f1) * (v - v1) / (v2 - v1)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let law = Law::of_code(Arc::new(Measured(vec![(0.0, 700e3), (100.0, 900e3), (400.0, 1.2e6)])));
    let at = |speed| Problem::of_stages(2.0, speed, [Stage::free()]).with_law(0, &law);
    println!("rest: {}", Diffsol::adaptive(1e-10).solve(&at(300.0), Detail::End)?.end);
    let slab = |speed| Ok(at(speed).with_exit(0.1));
    let critical = critical_velocity(slab, &Diffsol::adaptive(1e-10))?;
    println!("V_c of 0.1 m: {:.6} m/s", critical.velocity);
    Ok(())
}
