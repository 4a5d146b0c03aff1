//! `penetrode limit`: the thickness that just stops the projectile, by the equation of motion and by Eq. 11-12.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, engineering, error_text, say, significant};
use super::scene_json::SceneJson;
use super::solve::GroupsJson;
use super::{Answer, Ask, CliError, Exit, SceneArgs};
use crate::physics::groups::Groups;
use crate::physics::semi_empirical::{perforated_thickness_ratio, perforation_validity};
use crate::physics::{Criterion, Scene, Shown};
use crate::studies::{applicability, perforation_limit};
use crate::text::or_dash;

/// Arguments of `limit`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode limit paper-slab --set perforation.criterion=ndrc")]
pub struct LimitArgs {
    /// The scene; its thickness does not count.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
}

/// What `limit --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LimitJson {
    schema: &'static str,
    /// The scene against an unlimited target; with the criterion `plug`, against a slab of the limit.
    scene: SceneJson,
    groups: GroupsJson,
    method: MethodJson,
    /// Thickness that just stops the projectile, by the criterion of the scene.
    limit_thickness_m: f64,
    /// Half-width of its error bound; `null` where the method states none.
    limit_error_m: Option<f64>,
    /// e/d by each model and criterion; `null` for stages and layers.
    ratios: Option<LimitRatiosJson>,
}

/// Perforation limits over the diameter.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LimitRatiosJson {
    /// Of the equation of motion.
    equation_of_motion: LimitRatioJson,
    /// Of Eq. 11-12.
    eq11_12: LimitRatioJson,
    /// Whether e/d of the NDRC relation lies in its range for both.
    valid: bool,
    /// What is to be known of that range.
    note: String,
}

/// A depth and the two thicknesses that it perforates.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(non_snake_case, reason = "the ratios are named as in the paper")]
pub struct LimitRatioJson {
    X_over_d: f64,
    e_over_d_full_depth: f64,
    e_over_d_ndrc: f64,
}

impl LimitRatioJson {
    fn new(depth_ratio: f64) -> Self {
        let e_over_d_ndrc = perforated_thickness_ratio(depth_ratio);
        Self { X_over_d: depth_ratio, e_over_d_full_depth: depth_ratio, e_over_d_ndrc }
    }
}

impl Ask for LimitArgs {
    type Answer = LimitJson;

    fn ask(&self) -> Result<Answer<LimitJson>, CliError> {
        let scene = self.scene.settings.read(&self.scene.path)?;
        let method = self.method.build()?;
        let named = |error: perforation_limit::LimitError| CliError::from(error).in_file(&self.scene.path);
        let found = perforation_limit::of_scene(&scene, method.integrator()).map_err(named)?;
        // A plug needs a far side to break out of: that of the limit.
        let unlimited = match scene.criterion {
            Criterion::Plug => Scene { thickness: Some(found.thickness), ..scene.clone() },
            _ => perforation_limit::unlimited(&scene),
        };
        let problem = unlimited.problem()?;
        for warning in applicability::warnings(&scene, problem.impact_speed) {
            say("warning: ", &warning);
        }
        let ratios = Groups::of(&scene, problem.impact_speed).zip(scene.concrete()).map(|(groups, concrete)| {
            let ours = LimitRatioJson::new(found.depth / concrete.diameter);
            let eq11_12 = LimitRatioJson::new(groups.depth_ratio_eq11_12);
            let range = perforation_validity(ours.e_over_d_ndrc.max(eq11_12.e_over_d_ndrc));
            LimitRatiosJson { equation_of_motion: ours, eq11_12, valid: range.valid, note: range.note }
        });
        let data = LimitJson {
            schema: "penetrode/limit/1",
            scene: SceneJson::new(&unlimited, &problem),
            groups: GroupsJson::new(&unlimited, problem.impact_speed, found.depth),
            method: MethodJson::new(self.method.method, &self.method.options()?, Some(&problem), None),
            limit_thickness_m: found.thickness,
            limit_error_m: found.error,
            ratios,
        };
        Ok(Answer { text: data.text(), data: Some(data), exit: Exit::Success })
    }
}

impl LimitJson {
    fn text(&self) -> String {
        let mut text = Text::titled(self.scene.title.as_deref());
        let place = self.scene.criterion.place();
        text.line(format!("  method   {}, perforation at {place}", self.method.text()));
        let bar = self.limit_error_m.map_or(String::new(), |bar| format!(" +- {}", error_text(Some(bar))));
        text.line(format!(
            "  e        {}{bar} m, just stops {} m/s",
            Shown(self.limit_thickness_m),
            Shown(self.scene.velocity_m_s)
        ));
        text.lines(self.groups.text(self.scene.velocity_m_s));
        let Some(ratios) = &self.ratios else { return text.finish() };
        text.gap();
        let diameter = self.scene.diameter_m;
        let row = |name: &str, ratio: &LimitRatioJson| {
            let cell =
                |ratio: f64| format!("{} ({})", significant(ratio), or_dash(diameter, |d| engineering(ratio * d, "m")));
            [name.to_owned(), significant(ratio.X_over_d), cell(ratio.e_over_d_full_depth), cell(ratio.e_over_d_ndrc)]
        };
        let rows = [row("equation of motion", &ratios.equation_of_motion), row("Eq. 11-12", &ratios.eq11_12)];
        text.table(&["e/d", "X/d", "x = H", "NDRC relation"], rows);
        if !ratios.valid || ratios.note.contains("extrapolates") {
            text.wrapped("  ", &format!("the NDRC relation: {}", ratios.note));
        }
        text.finish()
    }
}
