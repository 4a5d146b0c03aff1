//! `penetrode formulas`: depth, perforation limit and scabbing limit by the published formulas, beside the equation of motion.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, check_table, engineering, write_table};
use super::scene_json::SceneJson;
use super::{Answer, Ask, CliError, Exit, SceneArgs};
use crate::exchange::tables::{Kind, Value, table_of};
use crate::physics::units::{Dimension, quantity};
use crate::physics::{Range, Scene};
use crate::report::sweep_figures;
use crate::studies::formulas::{self, Further, Nose, Said};
use crate::text::or_dash;

/// Arguments of `formulas`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode formulas paper-slab --out formulas.csv\n\n\
    Files: --out F.csv writes the formulas over the impact velocity, and beside it F.svg, the perforation limits of those that are confirmed.")]
pub struct FormulasArgs {
    /// The scene; its thickness does not count.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Nose of the formulas [default: the nearest by N*].
    #[arg(long, value_enum)]
    pub nose: Option<Nose>,
    /// Largest size of the aggregate, such as 20mm.
    ///
    /// Whiffen's formula and the limits of Kar's ask for it. A number alone is in metres.
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub aggregate: Option<String>,
    /// Write the formulas over the impact velocity to this CSV file, with a figure beside it.
    ///
    /// From a quarter of the impact velocity to twice it. - is standard output, without a figure.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
}

/// What `formulas --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FormulasJson {
    schema: &'static str,
    scene: SceneJson,
    method: MethodJson,
    /// Nose of the formulas.
    nose: Nose,
    /// The equation of motion by both criteria, then the formulas.
    formulas: Vec<Said>,
}

/// Columns of the table over the impact velocity.
const COLUMNS: [(&str, Kind); 7] = [
    ("velocity_m_s", Kind::Number),
    ("formula", Kind::Text),
    ("confirmed", Kind::Text),
    ("depth_m", Kind::Number),
    ("perforation_m", Kind::Number),
    ("scabbing_m", Kind::Number),
    ("not_valid", Kind::Text),
];

/// Impact velocities of the table.
const SPEEDS: u32 = 71;

impl Ask for FormulasArgs {
    type Answer = FormulasJson;

    fn table(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn ask(&self) -> Result<Answer<FormulasJson>, CliError> {
        check_table(&[("the scene", Path::new(&self.scene.path))], self.table(), &[""])?;
        let (scene, problem) = self.scene.settings.read_problem(&self.scene.path)?;
        let method = self.method.build()?;
        let further = Further { nose: self.nose, aggregate: self.aggregate.as_deref().map(length).transpose()? };
        let of = |scene: &Scene| formulas::of_scene(scene, further, method.integrator());
        let said = of(&scene).map_err(|error| CliError::from(error).in_file(&self.scene.path))?;
        if let Some(path) = &self.out {
            let speed = |i: u32| problem.impact_speed * (0.25 + 1.75 * f64::from(i) / f64::from(SPEEDS - 1));
            let at = |speed: f64| Ok((speed, of(&Scene { velocity: Some(speed), ..scene.clone() })?));
            let rows = (0..SPEEDS).map(speed).map(at).collect::<Result<Vec<_>, formulas::FormulaError>>()?;
            let lines = rows.iter().flat_map(|(speed, said)| said.iter().map(|said| line(*speed, said)));
            let lines: Vec<_> = lines.collect();
            let table = table_of(&COLUMNS, false, lines.iter().map(Vec::as_slice).map(<[_]>::to_vec));
            write_table(path, table, &[""], [sweep_figures::perforation_limits(&rows)])?;
        }
        let nose = formulas::nose_of(&scene, further)?;
        let data = FormulasJson {
            schema: "penetrode/formulas/1",
            scene: SceneJson::new(&scene, &problem),
            method: MethodJson::new(self.method.method, &self.method.options()?, Some(&problem), None),
            nose,
            formulas: said,
        };
        Ok(Answer { text: data.text(self.nose.is_some()), data: Some(data), exit: Exit::Success })
    }
}

/// The length (m) that was given to `--aggregate`.
fn length(text: &str) -> Result<f64, CliError> {
    let help = "write a length above zero, such as \"20 mm\", or metres";
    let value = text.trim().parse().or_else(|_| quantity(text, Dimension::Length));
    let value: f64 = value.map_err(|cause| CliError::usage(format!("--aggregate {text}: {cause}"), help))?;
    if Range::Positive.contains(value) {
        return Ok(value);
    }
    Err(CliError::usage(format!("--aggregate {text}: not {}", Range::Positive.description()), help))
}

/// A row of the table over the impact velocity.
fn line(speed: f64, said: &Said) -> Vec<Value<'_>> {
    let confirmed = if said.confirmed { "yes" } else { "no" };
    let numbers = [said.depth_m, said.perforation_m, said.scabbing_m].map(Value::Number);
    [Value::Number(Some(speed)), Value::Text(&said.name), Value::Text(confirmed)]
        .into_iter()
        .chain(numbers)
        .chain([Value::Text(said.not_valid.first().map_or("", String::as_str))])
        .collect()
}

impl FormulasJson {
    fn text(&self, is_nose_given: bool) -> String {
        let mut text = Text::titled(self.scene.title.as_deref());
        text.line(format!("  method  {}", self.method.text()));
        let why = if is_nose_given { "" } else { ", the nearest by N*; --nose takes another" };
        text.line(format!("  nose    {}{why}", self.nose));
        text.gap();
        let metres = |value: Option<f64>| or_dash(value, |value| engineering(value, "m"));
        let row = |said: &Said| {
            let name = said.year.map_or_else(|| said.name.clone(), |year| format!("{} ({year})", said.name));
            [name, metres(said.depth_m), metres(said.perforation_m), metres(said.scabbing_m)]
        };
        let header = ["", "depth x", "perforation limit e", "scabbing limit h"];
        let (confirmed, others): (Vec<_>, Vec<_>) = self.formulas.iter().partition(|said| said.confirmed);
        text.table(&header, confirmed.into_iter().map(row));
        text.gap();
        text.wrapped("  ", "unconfirmed: not read in two places, and left out of the figure");
        text.table(&header, others.into_iter().map(row));
        let reasons = self.formulas.iter().filter(|said| !said.not_valid.is_empty());
        let reasons: Vec<_> = reasons.map(|said| format!("{}: {}", said.name, said.not_valid.join("; "))).collect();
        if !reasons.is_empty() {
            text.gap();
            text.line("  not valid here");
            for reason in reasons {
                text.wrapped("  - ", &reason);
            }
        }
        text.finish()
    }
}
