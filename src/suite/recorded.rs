//! Scenes with numbers computed elsewhere: `verification/references/exact.json`, made by the recipe beside it.
//!
//! The recipe reads the texts of the scenes, resolves and solves them in 40 digits and shares nothing with this crate.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use crate::studies::quantity::Quantity;

/// A scene and what the recipe says of it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedScene {
    /// Its name; that of the shipped file where there is no text.
    pub name: String,
    /// Its text; `None` for a scene that ships.
    pub text: Option<String>,
    /// Words by the path of the field in the answers of `solve --json` and `critical --json`.
    pub words: BTreeMap<String, String>,
    /// Numbers in SI units with 25 digits, by that path.
    pub numbers: BTreeMap<String, String>,
    /// Condition numbers of some of them, where one is large.
    #[serde(default)]
    pub condition: BTreeMap<String, String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Recording {
    #[expect(dead_code, reason = "for people")]
    recipe: String,
    scenes: Vec<RecordedScene>,
}

/// All recorded scenes.
///
/// # Errors
/// Only if the shipped file is broken, which a test excludes; in words.
pub fn scenes() -> Result<&'static [RecordedScene], String> {
    static SCENES: LazyLock<Result<Vec<RecordedScene>, String>> = LazyLock::new(|| {
        let text = include_str!("../../verification/references/exact.json");
        serde_json::from_str::<Recording>(text).map(|read| read.scenes).map_err(|error| format!("exact.json: {error}"))
    });
    SCENES.as_deref().map_err(Clone::clone)
}

/// What is recorded of the shipped scene `name`.
pub fn shipped(name: &str) -> Option<&'static RecordedScene> {
    scenes().ok()?.iter().find(|scene| scene.text.is_none() && scene.name == name)
}

impl RecordedScene {
    /// Name of its outcome; empty where none is recorded.
    pub fn outcome(&self) -> &str {
        self.words.get("outcome").map_or("", String::as_str)
    }

    /// The number at `path`, rounded to `f64`.
    pub fn number(&self, path: &str) -> Option<f64> {
        self.numbers.get(path)?.parse().ok()
    }

    /// The exact value of `quantity`; `None` for what the scene does not have.
    pub fn value(&self, quantity: Quantity) -> Option<f64> {
        let of_crater_end = |field: &str| {
            let (path, _) = self.words.iter().find(|(path, word)| {
                path.starts_with("events.") && path.ends_with(".event") && *word == "crater-end"
            })?;
            self.number(&path.replace(".event", field))
        };
        match quantity {
            Quantity::Depth => self.number("depth_m"),
            Quantity::Time => self.number("time_s"),
            Quantity::Velocity => self.number("velocity_m_s"),
            Quantity::CraterEndTime => of_crater_end(".time_s"),
            Quantity::CraterEndVelocity => of_crater_end(".velocity_m_s"),
            Quantity::CriticalVelocity => self.number("critical_velocity_m_s"),
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing record is a failed test")]
mod tests {
    use super::*;
    use crate::exchange::scene_file::SHIPPED;

    #[test]
    fn every_shipped_scene_is_recorded_with_its_quantities() {
        for (name, _) in SHIPPED {
            let scene = shipped(name).unwrap();
            assert!(scene.value(Quantity::Depth).is_some() && scene.words.contains_key("outcome"), "{name}");
        }
        let tunnel = shipped("tunnel").unwrap();
        assert!(tunnel.value(Quantity::CraterEndVelocity).unwrap() > tunnel.value(Quantity::Velocity).unwrap());
        assert_eq!(tunnel.value(Quantity::CriticalVelocity), None);
    }
}
