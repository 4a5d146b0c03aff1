//! Time of a flight by every method, in lanes, of a critical velocity and of the closed form, each with its answer
//! asserted first.
//!
//! `cargo bench --manifest-path benches/flights/Cargo.toml` runs them; ids are `method/scene`. Besides the shipped scenes, 1,000 varied scenes from a
//! seed: one scene repeated flatters small solvers, whose branches the processor then knows. No accuracy is given up for
//! speed: the same run reports the worst error over the varied scenes against 50 digits.

#![expect(clippy::panic, reason = "a bench that cannot be set up stops")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use penetrode::exchange::scene_file::SHIPPED;
use penetrode::integrators::lanes::Batch;
use penetrode::integrators::{Accuracy, Detail, Flight, Integrator, Method, MethodName, MethodOptions, Taylor};
use penetrode::physics::reference::Source;
use penetrode::physics::{Outcome, Problem, Scene};
use penetrode::studies::critical_velocity;
use penetrode::studies::error::Truth;
use penetrode::studies::error::{flight_error, is_fixed};
use penetrode::studies::quantity::Quantity;
use penetrode::studies::random_scenes::{Generator, errors_of};

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
    let exact = Truth::of(problem).unwrap_or_else(|e| panic!("{e}")).flight;
    let flight = method.solve(problem, Detail::Events).unwrap_or_else(|e| panic!("{e}"));
    for quantity in [Quantity::Depth, Quantity::Time, Quantity::Velocity] {
        if is_fixed(quantity, &exact) {
            continue;
        }
        let error = flight_error(quantity, &flight, &exact, problem.impact_speed).map_or(f64::INFINITY, f64::abs);
        assert!(error <= limit, "{}: {} is off by {error:e}", method.name(), quantity.name());
    }
}

fn flights(criterion: &mut Criterion) {
    for name in MethodName::built() {
        let method = Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        for scene in SCENES {
            // The paper's scheme takes the millionth left to the far side for a stop, and that is its answer.
            if name == MethodName::CentralDifference && scene == "graze" {
                continue;
            }
            let problem = problem(scene);
            let limit = match (name.accuracy(), scene) {
                (Accuracy::Step, _) => 1e-2,
                (_, "graze") => 1e-1,
                (Accuracy::RoundOff | Accuracy::Exact, _) => 1e-12,
                (Accuracy::Tolerance, _) => 1e-6,
            };
            assert_right(method.integrator(), &problem, limit);
            criterion.bench_function(&format!("{name}/{scene}"), |bencher| {
                bencher.iter(|| method.integrator().solve(black_box(&problem), Detail::Events));
            });
        }
    }
}

/// The varied scenes.
fn varied_scenes() -> Vec<Scene> {
    let mut generator = Generator::new(1, "bench");
    (0..1000).map(|_| generator.next_scene()).collect()
}

/// Worst error of `flights` of `scenes` over max(1, condition number), against 50 digits, reported and held to `limit`.
fn assert_varied(name: &str, scenes: &[Scene], flights: impl IntoIterator<Item = Flight>, limit: f64) {
    let (mut worst, mut at, mut undecided) = (0.0, Quantity::Depth, 0);
    for (scene, flight) in scenes.iter().zip(flights) {
        undecided += u32::from(flight.outcome == Outcome::Undecided);
        let speed = scene.velocity.unwrap_or_else(|| panic!("a scene without a velocity"));
        let errors = errors_of(Source::Scene(scene, speed), &flight).unwrap_or_else(|e| panic!("{name}: {e}"));
        for (ulps, quantity) in errors.0 {
            let error = ulps * f64::EPSILON;
            assert!(error <= limit, "{name}: {} is off by {error:e}", quantity.name());
            if error > worst {
                (worst, at) = (error, quantity);
            }
        }
    }
    println!(
        "{name}/varied-1000: worst error {worst:.2e} ({}), {undecided} undecided, against 50 digits, over max(1, \
         condition number)",
        at.name()
    );
}

fn varied(criterion: &mut Criterion) {
    let scenes = varied_scenes();
    let problems: Vec<Problem> = scenes.iter().filter_map(|scene| scene.problem().ok()).collect();
    assert_eq!(problems.len(), 1000);
    let mut group = criterion.benchmark_group("varied-1000");
    group.throughput(Throughput::Elements(1000));
    for name in MethodName::built().filter(|name| name.accuracy() != Accuracy::Step) {
        let method = Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let limit = if name.accuracy() == Accuracy::Tolerance { 1e-6 } else { 1e-12 };
        let reused = method.integrator().reusing();
        let integrator = reused.as_deref().unwrap_or(method.integrator());
        let solve = |p| integrator.solve(p, Detail::Events).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_varied(name.name(), &scenes, problems.iter().map(solve), limit);
        group.bench_function(name.name(), |bencher| {
            bencher.iter(|| problems.iter().filter(|p| black_box(integrator.solve(p, Detail::Events)).is_ok()).count());
        });
    }
    group.finish();
}

/// Impact speeds about `speed`, by the golden section.
fn speeds(speed: f64) -> impl Iterator<Item = f64> {
    (0..200).map(move |i| speed * (0.8 + 0.4 * (f64::from(i) * 0.618_033_988_749_894_8).fract()))
}

/// The laws that ship; `laws.py` times other programs at the same speeds.
fn laws(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("laws");
    group.throughput(Throughput::Elements(200));
    for (name, _) in SHIPPED.iter().filter(|(name, _)| name.starts_with("law-")) {
        let scene = scene(name);
        let resolve = |speed| scene.resolve(speed).unwrap_or_else(|e| panic!("{name}: {e}"));
        let problems: Vec<Problem> = scene.velocity.into_iter().flat_map(speeds).map(resolve).collect();
        // A law that only approaches a depth has no time to compare.
        if Taylor::default().solve(&problems[0], Detail::End).is_err() {
            continue;
        }
        for problem in &problems {
            let strict =
                Method::new(MethodName::Tsit45, &MethodOptions { rtol: Some(1e-11), ..MethodOptions::default() });
            let strict = strict.unwrap_or_else(|e| panic!("{e}"));
            let [ours, theirs] = [&Taylor::default() as &dyn Integrator, strict.integrator()]
                .map(|method| method.solve(problem, Detail::End).unwrap_or_else(|e| panic!("{name}: {e}")));
            let off = [
                ours.end.depth / theirs.end.depth - 1.0,
                (ours.end.velocity - theirs.end.velocity) / problem.impact_speed,
            ];
            assert!(ours.outcome == theirs.outcome && off.iter().all(|off| off.abs() < 1e-7), "{name}: {off:?}");
        }
        let solve = |problem| Taylor::default().solve(problem, Detail::Events);
        group.bench_function(*name, |bencher| {
            bencher.iter(|| problems.iter().filter(|problem| black_box(solve(problem)).is_ok()).count());
        });
    }
    group.finish();
}

fn batch(criterion: &mut Criterion) {
    let scenes = varied_scenes();
    let varied: Vec<Problem> = scenes.iter().filter_map(|scene| scene.problem().ok()).collect();
    let solve = |problems: &[Problem]| Batch::new().solve(problems);
    let flights = solve(&varied).into_iter().map(|flight| flight.unwrap_or_else(|e| panic!("{e}")).flight());
    assert_varied("batch", &scenes, flights, 1e-12);
    let mut group = criterion.benchmark_group("batch");
    group.throughput(Throughput::Elements(1000));
    for name in SCENES {
        let problems = vec![problem(name); 1000];
        let scalar = Taylor::default().solve(&problems[0], Detail::Events).unwrap_or_else(|e| panic!("{e}"));
        for lane in solve(&problems) {
            let lane = lane.unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(lane.outcome, scalar.outcome);
            assert!((lane.end.depth / scalar.end.depth - 1.0).abs() < 1e-14, "{name}: {lane:?}");
        }
        group.bench_function(name, |bencher| bencher.iter(|| solve(black_box(&problems))));
    }
    group.bench_function("varied-1000", |bencher| bencher.iter(|| solve(black_box(&varied))));
    group.finish();
}

fn critical(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("critical");
    // So that it prints critical velocities per second.
    group.throughput(Throughput::Elements(1));
    let slab = scene("paper-slab");
    let exact = |scene: &Scene| critical_velocity::exact(scene).unwrap_or_else(|e| panic!("{e}"));
    // Beyond 100 km/s the closed form cannot tell V_c from its round-off.
    let thick: Vec<Scene> = varied_scenes().into_iter().filter(|s| s.thickness.is_some() && exact(s) < 1e5).collect();
    assert!(thick.len() > 400, "{}", thick.len());
    for name in [MethodName::Taylor, MethodName::Energy, MethodName::ClosedForm] {
        let method = Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let find = |scene: &Scene| {
            critical_velocity::of_scene(scene, method.integrator()).unwrap_or_else(|e| panic!("{e}")).velocity
        };
        for scene in thick.iter().chain([&slab]) {
            let (found, exact) = (find(scene), exact(scene));
            assert!((found - exact).abs() <= 1e-13 * exact, "{name}: {found} and not {exact}");
        }
        group.bench_function(format!("{name}/paper-slab"), |bencher| bencher.iter(|| find(black_box(&slab))));
        let mut next = thick.iter().cycle();
        group.bench_function(format!("{name}/varied"), |bencher| bencher.iter(|| next.next().map(find)));
    }
    group.finish();
}

criterion_group! {
    name = benches;
    // Fifty benches of eight seconds each would be more than anybody waits for.
    config = Criterion::default().warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(3));
    targets = flights, varied, laws, batch, critical
}
criterion_main!(benches);
