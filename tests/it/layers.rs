//! Layered targets, seen from outside: a scene file with layers becomes stages, and every road through them agrees.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use penetrode::integrators::{ClosedForm, Detail, Energy, Flight, Integrator, Taylor};
use penetrode::physics::{EventKind, Outcome, Problem, Scene};
use penetrode::studies::critical_velocity;

const LAYERED: &str = include_str!("../../verification/scenes/layered.toml");

fn scene(text: &str) -> Scene {
    Scene::from_toml(text, "test").unwrap_or_else(|error| panic!("{}", error.render(false)))
}

/// Layers of the given bodies behind a 50 mm, 10 kg ogive with k = 2, at `speed` (m/s).
fn layers(speed: f64, bodies: &[&str]) -> Scene {
    let layers: Vec<String> = bodies.iter().map(|body| format!("[[target.layer]]\n{body}\n")).collect();
    scene(&format!(
        "[projectile]\nmass = 10\ndiameter = 0.05\nnose = {{ shape = \"ogive\", caliber_radius_head = 3.0 }}\n{}\n\
         [impact]\nvelocity = {speed}\n",
        layers.concat()
    ))
}

const FACE: &str = "thickness = 0.12\nstrength = 60e6\ndensity = 2450";
const GAP: &str = "thickness = 0.3\nstrength = 0\ndensity = 0";
const BACKING: &str = "thickness = 0.2\nstrength = 40e6\ndensity = 2350";

fn kinds(flight: &Flight) -> Vec<EventKind> {
    flight.events.iter().map(|event| event.kind).collect()
}

/// Largest relative difference of depth, times and velocities (these by V0) of two flights with the same events.
fn difference(a: &Flight, b: &Flight, problem: &Problem) -> f64 {
    assert_eq!((a.outcome, a.stage), (b.outcome, b.stage));
    assert_eq!(kinds(a), kinds(b));
    let mut worst = 0.0_f64;
    for (a, b) in a.events.iter().zip(&b.events) {
        worst = worst
            .max((a.state.time / b.state.time - 1.0).abs())
            .max((a.state.depth / b.state.depth - 1.0).abs())
            .max((a.state.velocity - b.state.velocity).abs() / problem.impact_speed);
    }
    worst
}

/// `methods` differ from `exact` by less than 1e-13.
#[track_caller]
fn agree(problem: &Problem, exact: &Flight, methods: &[&dyn Integrator]) {
    for method in methods {
        let worst = difference(&method.solve(problem, Detail::Events).unwrap(), exact, problem);
        assert!(worst < 1e-13, "{} at {} m/s: {worst:e}", method.name(), problem.impact_speed);
    }
}

#[test]
fn layers_agree_with_the_piecewise_closed_form_to_1e_13() {
    let viscous = "thickness = 0.4\nstrength = 40e6\ndensity = 0\nviscosity = 2e3";
    let exact = |problem: &Problem| ClosedForm.solve(problem, Detail::Events).unwrap();
    for speed in [60.0, 120.0, 180.0, 210.0, 250.0, 290.0, 320.0, 500.0] {
        let problem = scene(LAYERED).resolve(speed).unwrap();
        agree(&problem, &exact(&problem), &[&Taylor::default(), &Energy::new()]);
    }
    // An air gap is crossed, and a viscous layer without drag has a closed form, too.
    let gap = layers(320.0, &[FACE, GAP, BACKING]).problem().unwrap();
    agree(&gap, &exact(&gap), &[&Taylor::default(), &Energy::new()]);
    for speed in [150.0, 250.0, 400.0] {
        let problem = layers(speed, &[FACE, viscous]).problem().unwrap();
        agree(&problem, &exact(&problem), &[&Taylor::default()]);
    }
}

#[test]
fn every_boundary_is_an_event_and_the_force_jumps_there() {
    let problem = scene(LAYERED).resolve(500.0).unwrap();
    let flight = Taylor::default().solve(&problem, Detail::Events).unwrap();
    assert_eq!(
        kinds(&flight),
        [EventKind::CraterEnd, EventKind::StageEnd(1), EventKind::StageEnd(2), EventKind::Exit],
        "crater, face, core, backing"
    );
    assert_eq!(flight.outcome, Outcome::Perforated);
    for (before, kind) in [(1, EventKind::StageEnd(1)), (2, EventKind::StageEnd(2))] {
        let state = flight.at(kind).unwrap();
        let force = |stage: usize| problem.stages[stage].force(state.depth, state.velocity);
        assert!((force(before) / force(before + 1) - 1.0).abs() > 0.05, "no jump at {kind:?}");
    }
    // The force is continuous where the crater ends, at that very speed.
    let end = flight.crater_end().unwrap();
    let force = |stage: usize| problem.stages[stage].force(end.depth, end.velocity);
    assert!((force(0) / force(1) - 1.0).abs() < 1e-14);
}

#[test]
fn critical_velocity_of_layers_is_the_piecewise_one() {
    for bodies in [&[FACE, BACKING][..], &[FACE, GAP, BACKING], &["thickness = 0.08\nstrength = 30e6\ndensity = 2300"]]
    {
        let scene = layers(300.0, bodies);
        let exact = critical_velocity::exact(&scene).unwrap();
        for method in [&Taylor::default() as &dyn Integrator, &Energy::new()] {
            let found = critical_velocity::of_scene(&scene, method).unwrap().velocity;
            assert!((found / exact - 1.0).abs() < 1e-13, "{} {bodies:?}: {found} {exact}", method.name());
        }
        // Just above it perforates, just below it does not.
        let outcome = |factor: f64| {
            Taylor::default().solve(&scene.resolve(exact * factor).unwrap(), Detail::End).unwrap().outcome
        };
        assert_eq!((outcome(1.0 + 1e-12), outcome(1.0 - 1e-12)), (Outcome::Perforated, Outcome::Stopped));
    }
}

#[test]
fn one_layer_is_the_homogeneous_target() {
    let layered = layers(300.0, &["thickness = 0.5\nstrength = 40e6\ndensity = 2350"]);
    let plain = scene(
        "[projectile]\nmass = 10\ndiameter = 0.05\nnose = { shape = \"ogive\", caliber_radius_head = 3.0 }\n\
         [target]\nthickness = 0.5\nstrength = 40e6\ndensity = 2350\n[impact]\nvelocity = 300\n",
    );
    let (a, b) = (layered.problem().unwrap(), plain.problem().unwrap());
    assert_eq!((a.stages, a.exit_depth), (b.stages, b.exit_depth));
    let (a, b) = (critical_velocity::exact(&layered).unwrap(), critical_velocity::exact(&plain).unwrap());
    assert!((a / b - 1.0).abs() < 1e-15, "{a} {b}");
}
