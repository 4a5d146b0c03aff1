//! The scene and its stages in the JSON of a command.

use schemars::JsonSchema;
use serde::Serialize;

use crate::physics::scene::{Ending, Force, Resistance};
use crate::physics::{Concrete, CraterStiffness, Criterion, Problem, Scene, Shown, Stage};

/// The scene in SI units; what a scene of stages does not have is `null`.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "`docs/reference.md` names every field with its unit")]
pub struct SceneJson {
    pub title: Option<String>,
    pub mass_kg: f64,
    pub diameter_m: Option<f64>,
    pub nose_factor: Option<f64>,
    pub strength_pa: Option<f64>,
    pub density_kg_m3: Option<f64>,
    pub thickness_m: Option<f64>,
    pub criterion: Criterion,
    #[serde(rename = "S")]
    pub static_factor: Option<f64>,
    #[serde(rename = "B")]
    pub inertia_factor: Option<f64>,
    #[serde(rename = "k")]
    pub crater_ratio: Option<f64>,
    pub velocity_m_s: f64,
    pub crater_stiffness_n_m: Option<f64>,
    pub static_force_n: Option<f64>,
    pub drag_kg_m: Option<f64>,
    pub exit_depth_m: Option<f64>,
    pub follows: Vec<String>,
    pub stages: Vec<Stage>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub forces: Vec<ForceJson>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub ends: Vec<EndJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default)]
    pub plug: Option<PlugJson>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub parameters: Vec<OwnParameterJson>,
}

/// The criterion `plug`, and the static thickness H* of the plug.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "`docs/reference.md` names every field with its unit")]
pub struct PlugJson {
    pub half_angle_deg: f64,
    pub shear_strength_pa: f64,
    pub static_thickness_m: f64,
}

/// The force of a stage that is an expression.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "`docs/reference.md` names every field with its unit")]
pub struct ForceJson {
    pub stage: usize,
    pub force: String,
}

/// The end of a stage that is no depth, and the mass that joins the projectile there.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "`docs/reference.md` names every field with its unit")]
pub struct EndJson {
    pub stage: usize,
    pub end_velocity_m_s: Option<f64>,
    pub until: Option<String>,
    pub add_mass_kg: Option<f64>,
}

impl EndJson {
    /// For people, the stage in front.
    pub fn text(&self) -> String {
        let condition = match (self.end_velocity_m_s, &self.until) {
            (Some(velocity), _) => format!("V = {} m/s", Shown(velocity)),
            (None, Some(until)) => until.clone(),
            (None, None) => "its end".to_owned(),
        };
        let mass = self.add_mass_kg.map_or(String::new(), |mass| format!(", {} kg join", Shown(mass)));
        format!("stage {}: {condition}{mass}", self.stage)
    }
}

/// The ends of `scene` that are no depths.
pub fn ends(scene: &Scene) -> impl Iterator<Item = EndJson> {
    scene.ends.iter().map(|(stage, end)| {
        let (end_velocity_m_s, until) = match &end.condition {
            Some(Ending::Velocity(velocity)) => (Some(*velocity), None),
            Some(Ending::Until(tape)) => (None, Some(tape.to_text())),
            None => (None, None),
        };
        EndJson { stage: *stage, end_velocity_m_s, until, add_mass_kg: end.add_mass }
    })
}

/// The stages of `problem`, those of `scene` where it gives coefficients.
fn stages(scene: &Scene, problem: &Problem) -> Vec<Stage> {
    let mut stages = problem.stages.to_vec();
    if let (false, Resistance::Stages(given)) = (scene.ends.is_empty(), &scene.resistance)
        && given.len() == stages.len()
    {
        for (index, stage) in stages.iter_mut().enumerate().filter(|(index, _)| scene.force_of(*index).is_none()) {
            *stage = given[index];
        }
    }
    stages
}

/// A parameter of the forces, in SI units.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "`docs/reference.md` names every field with its unit")]
pub struct OwnParameterJson {
    pub name: &'static str,
    pub value: f64,
    pub unit: String,
}

/// The forces of `scene` that are expressions, and of those that are tables of velocity what they hold.
pub fn forces(scene: &Scene) -> impl Iterator<Item = ForceJson> {
    scene.forces.iter().filter_map(|(stage, force)| match force {
        Force::Expression(tape) => Some(ForceJson { stage: *stage, force: tape.to_text() }),
        Force::SpeedTable(table) => {
            let text = format!("a table of V: {} rows, 0 to {} m/s", table.rows().len(), Shown(table.last()));
            Some(ForceJson { stage: *stage, force: text })
        }
        Force::Table(_) => None,
    })
}

impl SceneJson {
    /// `scene` as it resolved into `problem`.
    pub fn new(scene: &Scene, problem: &Problem) -> Self {
        // A plug makes laws of the stages; they are shown by their coefficients.
        let plain = scene.plug.and_then(|_| scene.judged_by(Criterion::FullDepth).resolve(problem.impact_speed).ok());
        let problem = plain.as_ref().unwrap_or(problem);
        let concrete = scene.concrete();
        let of = |get: fn(&Concrete) -> f64| concrete.map(get);
        // A layered target has no strength of its own: its layers are in the stages.
        let homogeneous = concrete.filter(|c| c.layers.is_empty());
        let of_one = |get: fn(&Concrete) -> f64| homogeneous.map(get);
        let given_stiffness = concrete.and_then(|c| match c.crater_stiffness {
            CraterStiffness::Given(value) => Some(value),
            CraterStiffness::Continuous => None,
        });
        Self {
            title: scene.title.clone(),
            mass_kg: scene.mass,
            diameter_m: of(|c| c.diameter),
            nose_factor: of(|c| c.nose_factor),
            strength_pa: of_one(|c| c.strength),
            density_kg_m3: of_one(|c| c.density),
            thickness_m: scene.thickness,
            criterion: scene.criterion,
            static_factor: of_one(|c| c.static_factor),
            inertia_factor: of(|c| c.inertia_factor),
            crater_ratio: of(|c| c.crater_ratio),
            velocity_m_s: problem.impact_speed,
            crater_stiffness_n_m: problem.crater.map(|i| problem.stages[i].stiffness).or(given_stiffness),
            static_force_n: homogeneous.and(scene.tunnel()).map(|law| law.static_force),
            drag_kg_m: homogeneous.and(scene.tunnel()).map(|law| law.drag),
            exit_depth_m: problem.has_exit().then_some(problem.exit_depth),
            follows: scene.follows(),
            stages: stages(scene, problem),
            forces: forces(scene).collect(),
            ends: ends(scene).collect(),
            plug: scene.plug.zip(scene.tunnel()).zip(concrete).map(|((plug, tunnel), concrete)| PlugJson {
                half_angle_deg: plug.half_angle,
                shear_strength_pa: plug.shear_strength,
                static_thickness_m: plug.static_thickness(tunnel.static_force, concrete.diameter),
            }),
            parameters: scene
                .parameters
                .iter()
                .map(|one| OwnParameterJson { name: one.name.text(), value: one.value, unit: one.unit.to_string() })
                .collect(),
        }
    }
}
