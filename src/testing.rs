//! Scenes, problems and random numbers that the unit tests share.

#![expect(clippy::unwrap_used, reason = "a missing value is a failed test")]

use crate::exchange::scene_file::SHIPPED;
use crate::integrators::{ClosedForm, Detail, Integrator};
use crate::physics::nose::NoseShape;
use crate::physics::{Concrete, CraterStiffness, Event, EventKind, Problem, Scene, Stage};
pub(crate) use crate::studies::random::Random;

/// The stage `p + s x + r V + q V²` until `end`.
pub(crate) fn stage(static_force: f64, stiffness: f64, viscosity: f64, drag: f64, end: f64) -> Stage {
    Stage { static_force, stiffness, viscosity, drag, end }
}

/// What happened, in order.
pub(crate) fn kinds<S>(events: &[Event<S>]) -> Vec<EventKind> {
    events.iter().map(|event| event.kind).collect()
}

/// The scene `name` of `verification/scenes`.
pub(crate) fn shipped(name: &str) -> Scene {
    Scene::from_toml(SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap().1, name).unwrap()
}

/// The target of Forrestal 1994, experiment 14 (Li & Chen 2003, table 2).
pub(crate) fn concrete() -> Concrete {
    Concrete {
        diameter: 0.0269,
        nose_factor: NoseShape::Ogive { caliber_radius_head: 2.0 }.factor(),
        strength: 35.2e6,
        density: 2370.0,
        static_factor: 12.0,
        follows_eq14: false,
        inertia_factor: 1.0,
        crater_ratio: 2.0,
        crater_stiffness: CraterStiffness::Continuous,
        layers: Vec::new(),
    }
}

/// Forrestal 1994, experiment 14, into a semi-infinite target.
pub(crate) fn scene() -> Scene {
    Scene { velocity: Some(277.0), ..Scene::of_concrete(0.906, concrete()) }
}

/// The stages in a row, with an exit depth.
pub(crate) fn of_stages(mass: f64, impact_speed: f64, exit_depth: f64, stages: &[Stage]) -> Problem {
    Problem::of_stages(mass, impact_speed, stages.iter().copied()).with_exit(exit_depth)
}

/// Crater with the continuous constant c, and tunnel (docs/theory.md, section 1).
pub(crate) fn continuous(mass: f64, p: f64, q: f64, kd: f64, speed: f64, exit_depth: f64) -> Problem {
    Problem::continuous(mass, speed, kd, Stage::tunnel(p, q)).with_exit(exit_depth)
}

/// The scene `tunnel` of the comparison of solvers: it stops at X = 0.14482620011221707, T = 8.2919669482493341e-4.
pub(crate) fn tunnel(exit_depth: f64) -> Problem {
    continuous(2.0, 848_230.016_469_244_3, 3.251_548_396_465_436, 0.1, 300.0, exit_depth)
}

/// Crater and tunnel, stopping in either or perforating, with the exit in all degrees of nearness to the place of rest.
pub(crate) fn random_concrete(random: &mut Random) -> Problem {
    let d: f64 = random.log_uniform(0.01, 0.1);
    let p = random.log_uniform(1e7, 1e9) * d * d;
    let q = if random.chance(0.2) { 0.0 } else { random.log_uniform(1.0, 3000.0) * d * d };
    let mass = random.log_uniform(0.1, 1000.0) * 4000.0 * d * d * d;
    let kd = random.uniform(0.5, 3.0) * d;
    let speed = (random.log_uniform(0.05, 300.0) * p * d / mass).sqrt();
    let endless = continuous(mass, p, q, kd, speed, f64::INFINITY);
    let rest = ClosedForm.solve(&endless, Detail::End).unwrap().end.depth;
    let side = if random.chance(0.5) { 1.0 } else { -1.0 };
    Problem { exit_depth: rest * (1.0 + side * random.log_uniform(1e-12, 0.9)), ..endless }
}
