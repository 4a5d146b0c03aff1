//! `penetrode export CODE SCENE --out DIR`: a scene as what a finite element code runs, and what to expect of it.

use std::f64::consts::FRAC_PI_4;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::time_option;
use super::output::{Text, engineering, error_text, table, table_lines};
use super::scene_json::SceneJson;
use super::{Answer, Ask, CliError, Exit, SceneArgs};
use crate::exchange::abaqus::Export;
use crate::exchange::input::{is_standard, name_of};
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, Integrator, VelocityAt};
use crate::physics::{Outcome, Problem, State};
use crate::report::folder;
use crate::studies::Quantity;
use crate::studies::error::{Truth, flight_error};

/// Arguments of `export`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode export abaqus paper-slab --out slab\n\n\
    Run it (README.md in the folder says how), then audit the histories: penetrode audit --run a.rpt=1us --run ...\n\n\
    There is no export to LS-DYNA: `penetrode export lsdyna SCENE` says why.")]
pub struct ExportArgs {
    /// The code.
    #[arg(value_enum)]
    pub code: Code,
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Fixed time increment, such as 1us.
    ///
    /// A number alone is in seconds; when left out, it follows from the stages.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub dt: Option<String>,
}

/// A finite element code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Code {
    /// Abaqus/Explicit: the user subroutine VDLOAD, and input decks.
    Abaqus,
    /// LS-DYNA: not written, with the reason.
    Lsdyna,
}

/// Why nothing is written for LS-DYNA.
const NO_LSDYNA: &str = "nothing is written for LS-DYNA: its user subroutine of *USER_LOADING has nodal velocities among its arguments, and no \
                         public text says whether they are those of the half step or of the step, how the initial velocity \
                         enters the first of them, or what becomes of a nodal force on a rigid body; so neither a deck nor \
                         what to expect of it can be checked";

/// What `export --json` prints, and `report.json` of the folder.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExportJson {
    schema: &'static str,
    scene: SceneJson,
    /// Area of the face to which the pressure is applied (m²).
    area_m2: f64,
    /// Fixed time increment (s).
    dt_s: f64,
    /// Time to be run (s).
    duration_s: f64,
    /// Answer of the equation of motion.
    exact: EndJson,
    /// What the code is to give: central differences with the velocity of the half step, ends seen at step ends.
    expected: Vec<ExpectedJson>,
    /// The files by name.
    files: Vec<String>,
}

/// How a flight ends.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EndJson {
    outcome: Outcome,
    #[serde(flatten)]
    end: State,
}

/// What to expect with one time increment in one precision; errors as `solve` gives them, `null` where the outcomes differ.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExpectedJson {
    dt_s: f64,
    precision: &'static str,
    #[serde(flatten)]
    end: EndJson,
    depth_error: Option<f64>,
    time_error: Option<f64>,
    velocity_error: Option<f64>,
}

/// Halvings of the time increment in the table of what to expect.
const HALVINGS: i32 = 3;

impl Ask for ExportArgs {
    type Answer = ExportJson;

    fn ask(&self) -> Result<Answer<ExportJson>, CliError> {
        if self.code == Code::Lsdyna {
            return Err(CliError::usage(
                NO_LSDYNA,
                "take `export abaqus`, or solve the scene by your own program and ask `diagnose`",
            ));
        }
        if is_standard(&self.out) {
            return Err(CliError::usage("a folder cannot go to standard output", "name a folder with --out"));
        }
        folder::check(&self.out, "export")?;
        let (scene, problem) = self.scene.settings.read_problem(&self.scene.path)?;
        let dt = match &self.dt {
            Some(text) => time_option(text, "write a time such as \"1 us\", or seconds")?,
            None => CentralDifference::default().time_step(&problem),
        };
        let exact = Truth::of(&problem)?.flight;
        let expected = expected(&problem, &exact, dt)?;
        let last = expected.iter().fold(exact.end.time, |last, row| last.max(row.end.end.time));
        let area = scene.concrete().map_or(1.0, |concrete| FRAC_PI_4 * concrete.diameter * concrete.diameter);
        let title = scene.title.clone().unwrap_or_else(|| name_of(Path::new(&self.scene.path)));
        let export = Export { title: &title, problem: &problem, area, time_step: dt, duration: last + 4.0 * dt };
        let mut files = export.files()?;
        files.push(("README.md".to_owned(), String::new()));
        let data = ExportJson {
            schema: "penetrode/export/1",
            scene: SceneJson::new(&scene, &problem),
            area_m2: area,
            dt_s: dt,
            duration_s: export.duration,
            exact: EndJson { outcome: exact.outcome, end: exact.end },
            expected,
            files: files.iter().map(|(name, _)| name.clone()).collect(),
        };
        if let Some((_, page)) = files.last_mut() {
            *page = data.page(&title);
        }
        let files = files.into_iter().map(|(name, text)| (name, text.into_bytes()));
        let report = serde_json::to_vec_pretty(&data).map_err(std::io::Error::other);
        folder::write(report.map(|report| files.chain([("report.json".to_owned(), report)]).collect()), &self.out)?;
        let mut text = Text::titled(Some(&title));
        text.line(format!("  outcome  {}", data.exact.outcome));
        text.line(format!("  dt       {}, {} in all", engineering(dt, "s"), engineering(data.duration_s, "s")));
        text.gap();
        text.lines(table_lines(&data.table()));
        text.gap();
        text.line(format!("{} is written; its README.md says how to run it", self.out.display()));
        Ok(Answer { text: text.finish(), data: Some(data), exit: Exit::Success })
    }
}

/// What the scheme of the code gives with `dt` (s) and its halves, in double and, with `dt`, in single precision.
fn expected(problem: &Problem, exact: &Flight, dt: f64) -> Result<Vec<ExpectedJson>, CliError> {
    let row = |dt: f64, precision, flight: Flight| {
        let same = flight.outcome.agrees_with(exact.outcome);
        let error =
            |quantity| flight_error(quantity, &flight, exact, problem.impact_speed).map(f64::abs).filter(|_| same);
        ExpectedJson {
            dt_s: dt,
            precision,
            end: EndJson { outcome: flight.outcome, end: flight.end },
            depth_error: error(Quantity::Depth),
            time_error: error(Quantity::Time),
            velocity_error: error(Quantity::Velocity),
        }
    };
    let scheme = |dt| CentralDifference::uniform(dt, VelocityAt::LaggedHalfStep, Boundaries::StepEnd);
    let double = (0..=HALVINGS).map(|halving| {
        let dt = dt * 0.5_f64.powi(halving);
        Ok(row(dt, "double", scheme(dt).solve(problem, Detail::End)?))
    });
    let mut rows = double.collect::<Result<Vec<_>, CliError>>()?;
    // What single precision cannot do, such as a number beyond its range, is no error of the export.
    if let Ok(single) = scheme(dt).solve_in(&problem.cast::<f32>(), Detail::End) {
        rows.push(row(dt, "single", single.values()));
    }
    Ok(rows)
}

impl ExportJson {
    /// What to expect, for people.
    fn table(&self) -> comfy_table::Table {
        let end = |State { time, depth, velocity }: State| {
            [(depth, "m"), (time, "s"), (velocity, "m/s")].map(|(value, unit)| engineering(value, unit))
        };
        let mut shown = table(&["dt", "precision", "depth", "time", "velocity", "largest error"]);
        for row in &self.expected {
            let worst = [row.depth_error, row.time_error, row.velocity_error].into_iter().flatten().reduce(f64::max);
            let error = worst.map_or_else(|| row.end.outcome.to_string(), |worst| error_text(Some(worst)));
            let head = [engineering(row.dt_s, "s"), row.precision.to_owned()];
            shown.add_row(head.into_iter().chain(end(row.end.end)).chain([error]));
        }
        shown
            .add_row(["exact".to_owned(), String::new()].into_iter().chain(end(self.exact.end)).chain([String::new()]));
        shown
    }

    /// The page that says how to run it and what to expect.
    fn page(&self, title: &str) -> String {
        let at = |row: &ExpectedJson| row.end.end.time - self.exact.end.time;
        let drift = self.expected.first().map_or(0.0, at);
        let lines: Vec<_> = table_lines(&self.table()).iter().map(|line| format!("    {}", line.trim_end())).collect();
        let table = lines.join("\n") + "\n";
        include_str!("templates/abaqus.md")
            .replace("@TITLE@", &crate::text::one_line(title))
            .replace("@VERSION@", env!("CARGO_PKG_VERSION"))
            .replace("@SECONDS@", &format!("{:e}", self.dt_s))
            .replace("@OUTCOME@", self.exact.outcome.name())
            .replace("@DRIFT@", &engineering(drift, "s"))
            .replace("@TABLE@", &table)
    }
}
