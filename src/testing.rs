//! Scenes, problems and random numbers that the unit tests share.

#![expect(clippy::unwrap_used, reason = "a missing value is a failed test")]

use crate::exchange::scene_file::SHIPPED;
use crate::physics::nose::NoseShape;
use crate::physics::{Concrete, CraterStiffness, Event, EventKind, Scene, Stage};
pub(crate) use crate::studies::random::Random;

/// The stage `p + s x + r V + q V²` until `end`.
pub(crate) fn stage(static_force: f64, stiffness: f64, viscosity: f64, drag: f64, end: f64) -> Stage {
    Stage { static_force, stiffness, viscosity, drag, end }
}

/// What happened, in order.
pub(crate) fn kinds(events: &[Event]) -> Vec<EventKind> {
    events.iter().map(|event| event.kind).collect()
}

/// The scene `name` of `verification/scenes`.
pub(crate) fn shipped(name: &str) -> Scene {
    Scene::from_toml(SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap().1, name).unwrap()
}

/// The target of Forrestal 1994, shot 14 (Li & Chen 2003, table 2).
pub(crate) fn concrete() -> Concrete {
    Concrete {
        diameter: 0.0269,
        nose_factor: NoseShape::Ogive { caliber_radius_head: 2.0 }.factor(),
        strength: 35.2e6,
        density: 2370.0,
        static_factor: 12.0,
        inertia_factor: 1.0,
        crater_ratio: 2.0,
        crater_stiffness: CraterStiffness::Continuous,
        layers: Vec::new(),
    }
}

/// Forrestal 1994, shot 14, into a semi-infinite target.
pub(crate) fn scene() -> Scene {
    Scene::of_concrete(0.906, concrete()).with_velocity(277.0)
}
