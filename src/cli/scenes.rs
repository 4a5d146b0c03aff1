//! `penetrode scenes`: the scenes that ship, which every command takes by their names.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::output::Text;
use super::scene_json::{ForceJson, forces};
use super::{Answer, Ask, CliError, Exit};
use crate::exchange::scene_file::{SHIPPED, shipped_like};
use crate::physics::Scene;

/// Arguments of `scenes`.
#[derive(Args, Debug)]
#[command(after_help = "Examples: penetrode scenes\n          penetrode scenes tunnel > mine.toml\n          \
    penetrode scenes --laws\n          \
    penetrode solve tunnel --set impact.velocity=400m/s")]
pub struct ScenesArgs {
    /// Print the file of this scene.
    pub name: Option<String>,
    /// List those whose force is an expression, with their formulas.
    #[arg(long, conflicts_with = "name")]
    pub laws: bool,
}

/// What `scenes --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ScenesJson {
    schema: &'static str,
    scenes: Vec<ShippedJson>,
}

/// A scene that ships.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ShippedJson {
    name: &'static str,
    title: String,
    /// Its forces that are expressions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    forces: Vec<ForceJson>,
    /// Its file.
    toml: &'static str,
}

impl Ask for ScenesArgs {
    type Answer = ScenesJson;

    fn ask(&self) -> Result<Answer<ScenesJson>, CliError> {
        let wanted = SHIPPED.iter().filter(|(name, _)| self.name.as_deref().is_none_or(|wanted| wanted == *name));
        let scene = |&(name, toml): &(&'static str, &'static str)| {
            let scene = Scene::from_toml(toml, name)?;
            let forces = forces(&scene).collect();
            Ok(ShippedJson { name, title: scene.title.unwrap_or_default(), forces, toml })
        };
        let mut scenes = wanted.map(scene).collect::<Result<Vec<_>, CliError>>()?;
        scenes.retain(|scene| !self.laws || !scene.forces.is_empty());
        let text = match (&self.name, scenes.first()) {
            (Some(name), None) => {
                let help = shipped_like(name, "`penetrode scenes` lists those that ship");
                return Err(CliError::usage(format!("no scene `{name}` ships"), help));
            }
            (Some(_), Some(scene)) => scene.toml.to_owned(),
            (None, _) if self.laws => formulas(&scenes),
            (None, _) => {
                let mut text = Text::default();
                text.table(&["scene", "what happens"], scenes.iter().map(|scene| [scene.name, &scene.title]));
                text.finish()
            }
        };
        let data = ScenesJson { schema: "penetrode/scenes/1", scenes };
        Ok(Answer { data: Some(data), text, exit: Exit::Success })
    }
}

/// Title and formulas of each scene, one line for each stage.
fn formulas(scenes: &[ShippedJson]) -> String {
    let mut text = Text::default();
    for scene in scenes {
        text.line(format!("{}: {}", scene.name, scene.title));
        for ForceJson { stage, force } in &scene.forces {
            let whose = if scene.forces.len() > 1 { format!("stage {stage}: ") } else { String::new() };
            text.wrapped("  ", &format!("{whose}F = {force}"));
        }
    }
    text.finish()
}
