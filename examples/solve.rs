//! One scene solved by several methods, each beside the closed form: `cargo run --example solve [SCENE.toml]`.

use std::error::Error;
use std::path::Path;

use penetrode::{CentralDifference, ClosedForm, Detail, Energy, Integrator, Scene, Taylor};

const SLAB: &str = r#"
title = "a slab of 180 mm"
projectile = { mass = "2 kg", diameter = "50 mm", nose = { factor = 0.72 } }
target = { strength = "36 MPa", density = "2300 kg/m^3", thickness = "180 mm" }
resistance = { S = 12.0, B = 1.0, k = 2.0 }
impact = { velocity = "400 m/s" }
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = match std::env::args().nth(1) {
        Some(path) => Scene::read(Path::new(&path))?,
        None => Scene::from_toml(SLAB, "slab.toml")?,
    };
    let problem = scene.problem()?;
    let exact = ClosedForm.solve(&problem, Detail::Events)?;
    println!("{}: {}", scene.title.as_deref().unwrap_or("a scene"), exact.outcome);
    for event in &exact.events {
        println!("  {:<10}  {}", event.kind.name(), event.state);
    }

    println!("\n{:<20}  {:>13}  {:>13}  {:>6}", "method", "error of V/V0", "error of t/t", "forces");
    let methods: [&dyn Integrator; 3] = [&Taylor::default(), &Energy::new(), &CentralDifference::default()];
    for method in methods {
        let flight = method.solve(&problem, Detail::End)?;
        println!(
            "{:<20}  {:>13.1e}  {:>13.1e}  {:>6}",
            method.name(),
            (flight.end.velocity - exact.end.velocity) / problem.impact_speed,
            flight.end.time / exact.end.time - 1.0,
            flight.cost.force_evaluations
        );
    }
    Ok(())
}
