//! Time of a flight by every method, of a critical velocity, and of the closed form, each with its answer asserted first.
//!
//! `cargo bench` runs them; ids are `method/scene`. Besides the shipped scenes, 1,000 varied scenes from a seed: one
//! scene repeated flatters small solvers, whose branches the processor then knows.

#![expect(clippy::panic, reason = "a bench that cannot be set up stops")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use penetrode::integrators::{ClosedForm, Detail, Integrator, Method, MethodName, MethodOptions, Taylor};
use penetrode::physics::scene_file::SHIPPED;
use penetrode::physics::{Problem, Scene};
use penetrode::studies::convergence::Yardstick;
use penetrode::studies::critical_velocity;
use penetrode::studies::error::{flight_error, is_fixed};
use penetrode::studies::quantity::Quantity;
use penetrode::studies::random_scenes::Generator;

/// The scenes of the comparison with other solvers.
const SCENES: [&str; 4] = ["crater", "tunnel", "perforate", "graze"];

fn scene(name: &str) -> Scene {
    let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text);
    Scene::from_toml(text.unwrap_or_else(|| panic!("no scene {name}")), name).unwrap_or_else(|e| panic!("{e}"))
}

fn problem(name: &str) -> Problem {
    scene(name).problem().unwrap_or_else(|e| panic!("{e}"))
}

/// Nobody times a wrong answer: every free quantity within `limit` of the exact one.
fn assert_right(method: &dyn Integrator, problem: &Problem, limit: f64) {
    let exact = Yardstick::of(problem).unwrap_or_else(|e| panic!("{e}")).flight;
    let flight = method.fly(problem, Detail::Events).unwrap_or_else(|e| panic!("{e}"));
    for quantity in [Quantity::Depth, Quantity::Time, Quantity::Velocity] {
        if is_fixed(quantity, &exact) {
            continue;
        }
        let error = flight_error(quantity, &flight, &exact, problem.impact_speed).map_or(f64::INFINITY, f64::abs);
        assert!(error <= limit, "{}: {} is off by {error:e}", method.name(), quantity.name());
    }
}

fn flights(criterion: &mut Criterion) {
    for name in MethodName::ALL.into_iter().filter(|m| m.is_built()) {
        let method = Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        for scene in SCENES {
            // The paper's scheme takes the millionth left to the far side for a stop, and that is its answer.
            if name == MethodName::CentralDifference && scene == "graze" {
                continue;
            }
            let problem = problem(scene);
            let limit = match (name, scene) {
                (MethodName::CentralDifference, _) => 1e-2,
                (_, "graze") => 1e-1,
                (MethodName::Taylor | MethodName::Energy | MethodName::ClosedForm, _) => 1e-12,
                _ => 1e-6,
            };
            assert_right(method.integrator(), &problem, limit);
            criterion.bench_function(&format!("{name}/{scene}"), |bencher| {
                bencher.iter(|| method.integrator().fly(black_box(&problem), Detail::Events));
            });
        }
    }
}

fn varied(criterion: &mut Criterion) {
    let mut generator = Generator::new(1, "bench");
    let problems: Vec<Problem> = (0..1000).filter_map(|_| generator.next_scene().problem().ok()).collect();
    assert_eq!(problems.len(), 1000);
    for (name, method) in [("taylor", &Taylor::default() as &dyn Integrator), ("closed-form", &ClosedForm)] {
        criterion.bench_function(&format!("{name}/varied-1000"), |bencher| {
            bencher.iter(|| problems.iter().filter(|p| black_box(method.fly(p, Detail::Events)).is_ok()).count());
        });
    }
}

fn critical(criterion: &mut Criterion) {
    let scene = scene("paper-slab");
    let exact = critical_velocity::exact(&scene).unwrap_or_else(|e| panic!("{e}"));
    for name in [MethodName::Taylor, MethodName::Energy, MethodName::ClosedForm] {
        let method = Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let found = critical_velocity::of_scene(&scene, method.integrator()).unwrap_or_else(|e| panic!("{e}"));
        assert!((found.velocity / exact - 1.0).abs() <= 1e-13, "{name}: {}", found.velocity);
        criterion.bench_function(&format!("critical/{name}"), |bencher| {
            bencher.iter(|| critical_velocity::of_scene(black_box(&scene), method.integrator()));
        });
    }
}

criterion_group!(benches, flights, varied, critical);
criterion_main!(benches);
