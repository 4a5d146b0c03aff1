//! `solve --sensitivities`: derivatives and elasticities, for people and as JSON.

use schemars::JsonSchema;
use serde::Serialize;

use super::CliError;
use super::output::Text;
use crate::physics::{Scene, Shown};
use crate::studies::applicability::drag_in_crater;
use crate::studies::sensitivity::{Sensitivity, by_closed_form, by_taylor, elasticity};
use crate::text::or_dash;

/// `sensitivities` in the JSON of `solve`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SensitivitiesJson {
    /// `taylor`: dual numbers through the integrator.
    pub method: &'static str,
    /// Largest difference of the elasticities from those of the closed form; `null` where it has none.
    pub disagreement: Option<f64>,
    /// One entry for each number of the scene.
    pub parameters: Vec<ParameterJson>,
    /// What was not computed, and why.
    pub notes: Vec<String>,
}

/// Derivatives with respect to one number, SI, and elasticities d ln y/d ln p; `null` where there is no such quantity.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ParameterJson {
    path: String,
    value: f64,
    depth: Option<DerivativeJson>,
    velocity: Option<DerivativeJson>,
    critical_velocity: Option<DerivativeJson>,
}

/// One derivative.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DerivativeJson {
    /// dy/dp, SI.
    pub derivative: f64,
    /// d ln y/d ln p.
    pub elasticity: Option<f64>,
}

impl SensitivitiesJson {
    /// Sensitivities of `scene` at its impact velocity.
    ///
    /// # Errors
    /// [`StudyError`](crate::studies::error::StudyError): the scene does not resolve, or has no solution.
    pub fn new(scene: &Scene) -> Result<Self, CliError> {
        let integrated = by_taylor(scene)?;
        let exact = by_closed_form(scene)?;
        let q = integrated.quantities;
        let speeds = [scene.velocity, q.critical_velocity].into_iter().flatten();
        let mut problems = speeds.filter_map(|speed| scene.resolve(speed).ok());
        let drag = problems.find_map(|problem| drag_in_crater(scene, &problem));
        let entry = |s: &Sensitivity| {
            let of = |derivative: Option<f64>, quantity: Option<f64>| {
                derivative.map(|d| DerivativeJson { derivative: d, elasticity: elasticity(Some(d), quantity, s.value) })
            };
            ParameterJson {
                path: s.parameter.to_string(),
                value: s.value,
                depth: of(s.depth, q.depth),
                velocity: of(s.velocity, q.velocity),
                critical_velocity: of(s.critical_velocity, q.critical_velocity),
            }
        };
        Ok(Self {
            method: "taylor",
            disagreement: exact.disagreement(&integrated),
            parameters: integrated.entries.iter().map(entry).collect(),
            notes: integrated.notes.into_iter().chain(drag).collect(),
        })
    }

    /// Adds the table of elasticities to `text`, and which numbers follow others.
    pub fn add_to(&self, text: &mut Text, follows: &[String]) {
        let row = |p: &ParameterJson| {
            let derivatives = [&p.depth, &p.velocity, &p.critical_velocity];
            let cells = derivatives.map(|d| or_dash(d.as_ref().and_then(|d| d.elasticity), |e| format!("{e:+.6}")));
            [p.path.clone(), Shown(p.value).to_string()].into_iter().chain(cells).collect::<Vec<_>>()
        };
        text.gap();
        text.table(&["elasticity to", "value (SI)", "X", "V_r", "V_c"], self.parameters.iter().map(row));
        let beside = self.disagreement.map_or("no closed form beside them".to_owned(), |difference| {
            format!("{difference:.1e} from those through the closed form")
        });
        text.line(format!("  dual numbers through taylor; {beside}"));
        for sentence in follows {
            text.wrapped("  ", sentence);
        }
        self.notes.iter().for_each(|note| text.wrapped("  note: ", note));
    }
}
