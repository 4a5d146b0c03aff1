//! Scenes with numbers computed elsewhere: `verification/references/exact.json`, of those with a law of their own `laws.json`, and
//! of the one that plugs `plug.json`, each made by the recipe beside it; and what other programs prove of scenes, `enclosed.json`
//! and `capd.json`.
//!
//! A recipe reads the texts of the scenes, resolves and solves them in 40 digits and shares nothing with this crate.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;
use serde::de::IntoDeserializer;

use crate::integrators::{Cost, Events, Flight};
use crate::physics::{Event, EventKind, Outcome, State};

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
    /// Numbers in SI units with 25 digits (19 where the scene is a text of the record), by that path.
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
/// Only if a shipped file is broken, which a test excludes; in words.
pub fn scenes() -> Result<&'static [RecordedScene], String> {
    static SCENES: LazyLock<Result<Vec<RecordedScene>, String>> = LazyLock::new(|| {
        let mut scenes = Vec::new();
        for (file, text) in [
            ("exact.json", include_str!("../../verification/references/exact.json")),
            ("laws.json", include_str!("../../verification/references/laws.json")),
            ("plug.json", include_str!("../../verification/references/plug.json")),
        ] {
            let read: Recording = serde_json::from_str(text).map_err(|error| format!("{file}: {error}"))?;
            scenes.extend(read.scenes);
        }
        Ok(scenes)
    });
    SCENES.as_deref().map_err(Clone::clone)
}

/// Another program that proves its answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Prover {
    /// Integrals in balls of FLINT, of forces of V alone.
    PythonFlint,
    /// The validated solver of the CAPD group, of p + s x + r V + q V².
    Capd,
}

/// What another program proves, of the decimals of scenes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Opinion {
    /// Its name and version.
    pub program: String,
    #[expect(dead_code, reason = "for people")]
    recipe: String,
    /// What it says.
    pub scenes: Vec<EnclosedScene>,
}

/// What another program proves of one scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnclosedScene {
    /// Its name; that of the shipped file where there is no text.
    pub name: String,
    /// Its text, whose numbers are `f64` too; `None` for a scene that ships.
    pub text: Option<String>,
    /// `stopped`, `perforated`, or `undecided`.
    pub outcome: String,
    /// Events in time order, up to what the program refused.
    pub events: Vec<EnclosedEvent>,
    /// Why it refused the rest.
    #[serde(default)]
    pub refused: Option<String>,
}

/// An event between two decimals each.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnclosedEvent {
    /// Its kind, as `solve --json` names it.
    pub event: String,
    /// Time (s).
    pub time_s: [String; 2],
    /// Depth (m).
    pub depth_m: [String; 2],
    /// Velocity (m/s).
    pub velocity_m_s: [String; 2],
}

/// What `prover` says.
///
/// # Errors
/// Only if a shipped file is broken, which a claim would see; in words.
pub fn opinion(prover: Prover) -> Result<&'static Opinion, String> {
    type Read = LazyLock<Result<Opinion, String>>;
    fn read(text: &str) -> Result<Opinion, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }
    static FLINT: Read = LazyLock::new(|| read(include_str!("../../verification/references/enclosed.json")));
    static CAPD: Read = LazyLock::new(|| read(include_str!("../../verification/references/capd.json")));
    let found = match prover {
        Prover::PythonFlint => &FLINT,
        Prover::Capd => &CAPD,
    };
    found.as_ref().map_err(Clone::clone)
}

/// What is recorded of the shipped scene `name`.
pub fn shipped(name: &str) -> Option<&'static RecordedScene> {
    scenes().ok()?.iter().find(|scene| scene.text.is_none() && scene.name == name)
}

impl RecordedScene {
    /// The number at `path`, rounded to `f64`.
    pub fn number(&self, path: &str) -> Option<f64> {
        self.numbers.get(path)?.parse().ok()
    }

    /// Its flight as recorded: outcome, end, events and exit margin, rounded to `f64`.
    ///
    /// # Errors
    /// Only if the record lacks one of them, which a test excludes; in words.
    pub fn flight(&self) -> Result<Flight, String> {
        let lacks = |path: &str| format!("there is no {path} of {}", self.name);
        let number = |path: String| self.number(&path).ok_or_else(|| lacks(&path));
        let state = |prefix: &str| {
            Ok::<_, String>(State {
                time: number(format!("{prefix}time_s"))?,
                depth: number(format!("{prefix}depth_m"))?,
                velocity: number(format!("{prefix}velocity_m_s"))?,
            })
        };
        let outcome = self.words.get("outcome").ok_or_else(|| lacks("outcome"))?.as_str();
        let outcome: Result<Outcome, serde::de::value::Error> = Outcome::deserialize(outcome.into_deserializer());
        let mut events = Events::new();
        while let Some(name) = self.words.get(&format!("events.{}.event", events.len())) {
            let prefix = format!("events.{}.", events.len());
            let kind = match name.as_str() {
                "crater-end" => EventKind::CraterEnd,
                "plug" => EventKind::Plug,
                "rest" => EventKind::Rest,
                "exit" => EventKind::Exit,
                _ => EventKind::StageEnd(number(format!("{prefix}stage"))? as usize),
            };
            events.push(Event { kind, state: state(&prefix)? });
        }
        Ok(Flight {
            outcome: outcome.map_err(|error| format!("{}: {error}", self.name))?,
            stage: number("stage".to_owned())? as usize,
            end: state("")?,
            events,
            exit_margin: self.number("exit_margin"),
            exit_margin_error: None,
            cost: Cost::default(),
            trajectory: Vec::new(),
            step_limit: None,
            notes: Vec::new(),
        })
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
            assert!(scene.flight().unwrap().end.depth > 0.0, "{name}");
        }
        let tunnel = shipped("tunnel").unwrap();
        let flight = tunnel.flight().unwrap();
        assert!(flight.crater_end().unwrap().velocity > flight.end.velocity && flight.events.len() == 2);
        assert_eq!(tunnel.number("critical_velocity_m_s"), None);
    }
}
