//! Instructions of a flight by every method, of a critical velocity and of a batch, and what each saving that
//! `--explain` names is worth: counted by Callgrind, so that no load on the machine changes them.
//!
//! `cargo bench --bench instructions` runs them; it needs valgrind and the runner (CONTRIBUTING.md, "Tests"). Each answer
//! is asserted in the setup, which is not counted.

#![expect(clippy::panic, reason = "a bench that cannot be set up stops")]
#![expect(missing_docs, reason = "the macros of the bench make public items without any")]

use std::hint::black_box;

use gungraun::Callgrind;
use gungraun::prelude::*;
use penetrode::integrators::batch::{Batch, Summary};
use penetrode::integrators::{Detail, Flight, IntegrationError, Method, MethodName, MethodOptions};
use penetrode::physics::scene_file::SHIPPED;
use penetrode::physics::{Problem, Scene};
use penetrode::studies::convergence::Yardstick;
use penetrode::studies::critical_velocity::{self, CriticalVelocity};
use penetrode::studies::error::{flight_error, is_fixed};
use penetrode::studies::quantity::Quantity;
use penetrode::studies::random_scenes::Generator;
use penetrode::studies::sensitivity;

fn scene(name: &str) -> Scene {
    let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text);
    Scene::from_toml(text.unwrap_or_else(|| panic!("no scene {name}")), name).unwrap_or_else(|e| panic!("{e}"))
}

fn problem(name: &str) -> Problem {
    scene(name).problem().unwrap_or_else(|e| panic!("{e}"))
}

fn method(name: MethodName) -> Method {
    Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// A method and a problem that it solves to `limit` in every free quantity.
fn right(name: MethodName, problem: Problem, limit: f64) -> (Method, Problem) {
    let method = method(name);
    let exact = Yardstick::of(&problem).unwrap_or_else(|e| panic!("{e}")).flight;
    let flight = method.integrator().fly(&problem, Detail::Events).unwrap_or_else(|e| panic!("{e}"));
    for quantity in [Quantity::Depth, Quantity::Time, Quantity::Velocity] {
        if !is_fixed(quantity, &exact) {
            let error = flight_error(quantity, &flight, &exact, problem.impact_speed).map_or(f64::INFINITY, f64::abs);
            assert!(error <= limit, "{name}: {} is off by {error:e}", quantity.name());
        }
    }
    (method, problem)
}

/// Every method of this build on the scenes of the comparison with other solvers.
fn flights() -> impl Iterator<Item = (MethodName, &'static str)> {
    MethodName::ALL.into_iter().filter(|name| name.is_built()).flat_map(|name| {
        // The paper's scheme takes the millionth left to the far side of `graze` for a stop.
        let scenes = ["crater", "tunnel", "perforate", "graze"].into_iter();
        scenes.filter(move |scene| name != MethodName::CentralDifference || *scene != "graze").map(move |s| (name, s))
    })
}

fn setup_flight((name, scene): (MethodName, &str)) -> (Method, Problem) {
    let limit = match (name, scene) {
        (MethodName::CentralDifference, _) => 1e-2,
        (_, "graze") => 1e-1,
        (MethodName::Taylor | MethodName::Energy | MethodName::ClosedForm, _) => 1e-12,
        _ => 1e-6,
    };
    right(name, problem(scene), limit)
}

#[library_benchmark]
#[benches::scene(iter = flights(), setup = setup_flight)]
fn flight((method, problem): (Method, Problem)) -> Result<Flight, IntegrationError> {
    black_box(method.integrator().fly(black_box(&problem), Detail::Events))
}

fn setup_critical(name: MethodName) -> (Method, Scene) {
    let (scene, method) = (scene("paper-slab"), method(name));
    let exact = critical_velocity::exact(&scene).unwrap_or_else(|e| panic!("{e}"));
    let found = critical_velocity::of_scene(&scene, method.integrator()).unwrap_or_else(|e| panic!("{e}"));
    assert!((found.velocity / exact - 1.0).abs() <= 1e-13, "{name}: {}", found.velocity);
    (method, scene)
}

#[library_benchmark]
#[bench::taylor(setup_critical(MethodName::Taylor))]
#[bench::energy(setup_critical(MethodName::Energy))]
#[bench::closed_form(setup_critical(MethodName::ClosedForm))]
fn critical((method, scene): (Method, Scene)) -> CriticalVelocity {
    black_box(critical_velocity::of_scene(black_box(&scene), method.integrator()).unwrap_or_else(|e| panic!("{e}")))
}

/// `problems`, which lanes and the scalar series answer alike.
fn setup_batch(problems: Vec<Problem>) -> Vec<Problem> {
    for (lane, problem) in Batch::new().fly(&problems).into_iter().zip(&problems) {
        let lane = lane.unwrap_or_else(|e| panic!("{e}"));
        let scalar = right(MethodName::Taylor, problem.clone(), 1e-9).0;
        let scalar = scalar.integrator().fly(problem, Detail::Events).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(lane.outcome, scalar.outcome);
        assert!((lane.end.depth / scalar.end.depth - 1.0).abs() < 1e-13, "{lane:?}");
    }
    problems
}

fn varied() -> Vec<Problem> {
    let mut generator = Generator::new(1, "bench");
    (0..1000).filter_map(|_| generator.next_scene().problem().ok()).collect()
}

// A thousand scenes each: a thousandth is a scene's.
#[library_benchmark]
#[bench::tunnel_1000(setup_batch(vec![problem("tunnel"); 1000]))]
#[bench::perforate_1000(setup_batch(vec![problem("perforate"); 1000]))]
#[bench::crater_1000(setup_batch(vec![problem("crater"); 1000]))]
#[bench::varied_1000(setup_batch(varied()))]
fn batch(problems: Vec<Problem>) -> Vec<Result<Summary, IntegrationError>> {
    black_box(Batch::new().fly(black_box(&problems)))
}

library_benchmark_group!(name = counts, benchmarks = [flight, critical, batch]);

/// A flight, and what else is asked of it.
struct Request {
    method: Method,
    problems: Vec<Problem>,
    detail: Detail,
    /// The scene whose sensitivities are computed as well.
    sensitivities_of: Option<Scene>,
}

impl Request {
    fn new(name: MethodName, problem: Problem) -> Self {
        let (method, problem) = right(name, problem, 1e-6);
        Self { method, problems: vec![problem], detail: Detail::Events, sensitivities_of: None }
    }

    fn with(self, detail: Detail) -> Self {
        Self { detail, ..self }
    }

    fn fly(&self) -> Vec<Result<Flight, IntegrationError>> {
        if let Some(scene) = &self.sensitivities_of {
            let _ = black_box(sensitivity::by_taylor(scene));
        }
        self.problems.iter().map(|problem| self.method.integrator().fly(problem, self.detail)).collect()
    }
}

fn taylor(problem: Problem) -> Request {
    Request::new(MethodName::Taylor, problem)
}

/// `crater`, which stops before its second stage, and that stage alone beside it: what a method pays that builds it.
fn with_second_stage() -> Request {
    let crater = problem("crater");
    let mut second = crater.clone();
    second.stages = crater.stages[1..].iter().copied().collect();
    second.crater = None;
    let mut request = taylor(crater);
    request.problems.push(second);
    request
}

/// `tunnel` with a far side that it does not reach.
fn with_exit() -> Problem {
    let mut scene = scene("tunnel");
    scene.thickness = Some(1.0);
    scene.problem().unwrap_or_else(|e| panic!("{e}"))
}

/// `tunnel`, and its sensitivities by the same series in dual numbers.
fn with_sensitivities() -> Request {
    let by_closed_form = sensitivity::by_closed_form(&scene("tunnel")).unwrap_or_else(|e| panic!("{e}"));
    let found = sensitivity::by_taylor(&scene("tunnel")).unwrap_or_else(|e| panic!("{e}"));
    assert!(found.disagreement(&by_closed_form).is_some_and(|worst| worst < 1e-12));
    Request { sensitivities_of: Some(scene("tunnel")), ..taylor(problem("tunnel")) }
}

/// Without the library there is no method with a Jacobian to compare with.
const EXPLICIT: MethodName = if cfg!(feature = "diffsol") { MethodName::Tsit45 } else { MethodName::Energy };
const IMPLICIT: MethodName = if cfg!(feature = "diffsol") { MethodName::Bdf } else { MethodName::Energy };

// Each saving made, by the name that `--explain` gives it.
#[library_benchmark]
#[bench::stage_not_built(taylor(problem("crater")))]
#[bench::exit_not_sought(taylor(problem("tunnel")))]
#[bench::depth_only(taylor(problem("tunnel")).with(Detail::End))]
#[bench::trajectory_not_kept(taylor(problem("tunnel")))]
#[bench::jacobian_not_built(Request::new(EXPLICIT, problem("tunnel")))]
#[bench::sensitivities_not_computed(taylor(problem("tunnel")))]
#[bench::closed_form(Request::new(MethodName::ClosedForm, problem("tunnel")))]
fn with_saving(request: Request) -> Vec<Result<Flight, IntegrationError>> {
    black_box(black_box(request).fly())
}

// The same requests without it.
#[library_benchmark]
#[bench::stage_not_built(with_second_stage())]
#[bench::exit_not_sought(taylor(with_exit()))]
#[bench::depth_only(taylor(problem("tunnel")))]
#[bench::trajectory_not_kept(taylor(problem("tunnel")).with(Detail::Trajectory))]
#[bench::jacobian_not_built(Request::new(IMPLICIT, problem("tunnel")))]
#[bench::sensitivities_not_computed(with_sensitivities())]
#[bench::closed_form(taylor(problem("tunnel")))]
fn without_saving(request: Request) -> Vec<Result<Flight, IntegrationError>> {
    black_box(black_box(request).fly())
}

library_benchmark_group!(name = savings, compare_by_id = true, benchmarks = [with_saving, without_saving]);

main!(
    config = LibraryBenchmarkConfig::default().tool(Callgrind::with_args(["--cache-sim=no"])),
    library_benchmark_groups = [counts, savings]
);
