//! `penetrode solve`: one flight, beside the exact answer.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{
    check_outputs, engineering, error_text, escape_terminal, print_json, print_text, significant, table, table_lines,
    takes_standard_output, tell, wrapped, write_all,
};
use super::scene_json::SceneJson;
use super::sensitivities::SensitivitiesJson;
use super::{CliError, Exit, problem_of, read_scene};
use crate::integrators::closed_form::ClosedForm;
use crate::integrators::{Detail, Flight, Integrator};
use crate::physics::groups::Groups;
use crate::physics::{EventKind, Outcome, Problem, Scene, Shown};
use crate::studies::applicability;
use crate::studies::error::flight_error;
use crate::studies::quantity::Quantity;

/// Arguments of `solve`.
#[derive(Args, Debug)]
pub struct SolveArgs {
    /// Scene file (TOML), or - for standard input.
    pub scene: String,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write every step and event to this CSV file; - for standard output, in place of the answer.
    #[arg(long, value_name = "F.csv")]
    pub trajectory: Option<PathBuf>,
    /// Say what the scene let the method skip, and why.
    #[arg(long)]
    pub explain: bool,
    /// Derivatives of depth, residual and critical velocity with respect to every number of the scene.
    #[arg(long)]
    pub sensitivities: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `solve --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct SolveJson {
    pub schema: &'static str,
    pub scene: SceneJson,
    pub groups: GroupsJson,
    pub method: MethodJson,
    pub outcome: &'static str,
    pub stage: usize,
    pub depth_m: f64,
    pub time_s: f64,
    pub velocity_m_s: f64,
    /// Least W = V² over V0² at the stage ends and the exit, below zero for a stop: the exit energy unless a stage drives.
    pub exit_margin: Option<f64>,
    /// Half-width of its error bar.
    pub exit_margin_error: Option<f64>,
    pub events: Vec<EventJson>,
    pub cost: CostJson,
    pub closed_form: Option<ClosedFormJson>,
    pub relative_error: Option<RelativeErrorJson>,
    pub skipped: Vec<String>,
    /// Asked for with `--sensitivities`; `null` otherwise.
    pub sensitivities: Option<SensitivitiesJson>,
}

/// The groups of Eq. 13; `null` where the scene has none.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field")]
#[expect(non_snake_case, reason = "the groups are named as in the paper")]
pub struct GroupsJson {
    pub I: Option<f64>,
    pub N: Option<f64>,
    pub H_over_d: Option<f64>,
    pub X_over_d: Option<f64>,
}

/// One event.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct EventJson {
    pub event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<usize>,
    pub time_s: f64,
    pub depth_m: f64,
    pub velocity_m_s: f64,
}

/// Work done.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field")]
pub struct CostJson {
    pub steps: u64,
    pub rejected_steps: u64,
    pub force_evaluations: u64,
    pub wall_ns: u64,
}

/// The exact answer.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct ClosedFormJson {
    pub outcome: &'static str,
    pub depth_m: f64,
    pub time_s: f64,
    pub velocity_m_s: f64,
    pub crater_end_time_s: Option<f64>,
    pub crater_end_velocity_m_s: Option<f64>,
}

/// Errors against the exact answer: depth and times relative to it, velocities relative to V0.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field")]
pub struct RelativeErrorJson {
    pub depth: Option<f64>,
    pub time: Option<f64>,
    pub velocity: Option<f64>,
    pub crater_end_time: Option<f64>,
    pub crater_end_velocity: Option<f64>,
}

impl RelativeErrorJson {
    /// Errors of `flight` against `exact`, at impact speed `impact_speed` [m/s]; `None` where the outcomes differ.
    pub fn new(flight: &Flight, exact: &Flight, impact_speed: f64) -> Option<Self> {
        if !flight.outcome.agrees_with(exact.outcome) {
            return None;
        }
        let error = |quantity| flight_error(quantity, flight, exact, impact_speed).map(f64::abs);
        Some(Self {
            depth: error(Quantity::Depth),
            time: error(Quantity::Time),
            velocity: error(Quantity::Velocity),
            crater_end_time: error(Quantity::CraterEndTime),
            crater_end_velocity: error(Quantity::CraterEndVelocity),
        })
    }
}

impl From<&Flight> for ClosedFormJson {
    fn from(exact: &Flight) -> Self {
        Self {
            outcome: exact.outcome.name(),
            depth_m: exact.end.depth,
            time_s: exact.end.time,
            velocity_m_s: exact.end.velocity,
            crater_end_time_s: exact.crater_end().map(|s| s.time),
            crater_end_velocity_m_s: exact.crater_end().map(|s| s.velocity),
        }
    }
}

impl SolveArgs {
    /// Flies the scene and prints the answer.
    ///
    /// # Errors
    /// A scene or options that cannot be used (exit 2), a flight without an answer (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        let scene = read_scene(&self.scene)?;
        let is_table_printed = takes_standard_output(self.trajectory.as_deref(), self.json)?;
        if let Some(path) = &self.trajectory {
            check_outputs(&[("the scene", Path::new(&self.scene))], &[("the trajectory", path)])?;
        }
        let problem = problem_of(&scene, &self.scene)?;
        let method = self.method.build()?;
        let detail = if self.trajectory.is_some() { Detail::Trajectory } else { Detail::Events };
        let started = Instant::now();
        let flight = method.integrator().fly(&problem, detail)?;
        let wall_ns = u64::try_from(started.elapsed().as_nanos()).unwrap_or(u64::MAX);
        let exact = ClosedForm.fly(&problem, Detail::Events).ok();
        if let Some(warning) = scene.exit_depth_warning() {
            tell("warning: ", &warning);
        }
        if let Some(path) = &self.trajectory {
            write_all(&[(path.clone(), trajectory_csv(&flight).into_bytes())])?;
        }
        for warning in applicability::warnings(&scene, problem.impact_speed) {
            tell("warning: ", &warning);
        }
        let mut skipped = method.explain(&problem, &flight, detail);
        let sensitivities = if self.sensitivities {
            skipped.retain(|note| !note.starts_with("sensitivities"));
            Some(SensitivitiesJson::new(&scene)?)
        } else {
            None
        };
        if is_table_printed {
            return Ok(exit_of(&flight));
        }
        if self.json {
            let mut json = self.json(&scene, &problem, &flight, exact.as_ref(), skipped, wall_ns)?;
            json.sensitivities = sensitivities;
            print_json(&json)
        } else {
            let mut text = self.text(&scene, &problem, &flight, exact.as_ref(), &skipped)?;
            if let Some(sensitivities) = &sensitivities {
                text.push_str(&sensitivities.text());
            }
            print_text(&text)
        }
        .map_err(CliError::stdout)?;
        Ok(exit_of(&flight))
    }

    fn json(
        &self,
        scene: &Scene,
        problem: &Problem,
        flight: &Flight,
        exact: Option<&Flight>,
        skipped: Vec<String>,
        wall_ns: u64,
    ) -> Result<SolveJson, CliError> {
        let groups = Groups::of(scene, problem.impact_speed);
        Ok(SolveJson {
            schema: "penetrode/solve/1",
            scene: SceneJson::new(scene, problem),
            groups: GroupsJson {
                I: groups.map(|g| g.impact),
                N: groups.and_then(|g| g.geometry),
                H_over_d: groups.and_then(|g| g.thickness_ratio),
                X_over_d: scene.diameter().map(|d| flight.end.depth / d),
            },
            method: MethodJson::new(self.method.method, &self.method.options()?, Some(problem), Some(flight)),
            outcome: flight.outcome.name(),
            stage: flight.stage,
            depth_m: flight.end.depth,
            time_s: flight.end.time,
            velocity_m_s: flight.end.velocity,
            exit_margin: flight.exit_margin,
            exit_margin_error: flight.exit_margin_error,
            events: flight
                .events
                .iter()
                .map(|e| EventJson {
                    event: e.kind.name(),
                    stage: match e.kind {
                        EventKind::StageEnd(index) => Some(index),
                        _ => None,
                    },
                    time_s: e.state.time,
                    depth_m: e.state.depth,
                    velocity_m_s: e.state.velocity,
                })
                .collect(),
            cost: CostJson {
                steps: flight.cost.steps,
                rejected_steps: flight.cost.rejected_steps,
                force_evaluations: flight.cost.force_evaluations,
                wall_ns,
            },
            closed_form: exact.map(ClosedFormJson::from),
            relative_error: exact.and_then(|e| RelativeErrorJson::new(flight, e, problem.impact_speed)),
            skipped,
            sensitivities: None,
        })
    }

    fn text(
        &self,
        scene: &Scene,
        problem: &Problem,
        flight: &Flight,
        exact: Option<&Flight>,
        skipped: &[String],
    ) -> Result<String, CliError> {
        let mut text = String::new();
        let mut line = |s: &str| {
            text.push_str(s.trim_end());
            text.push('\n');
        };
        if let Some(title) = &scene.title {
            line(&escape_terminal(title));
        }
        let options = self.method.options()?;
        let json = MethodJson::new(self.method.method, &options, Some(problem), Some(flight));
        let mut tuning = match (json.rtol, json.dt_s) {
            (Some(Some(rtol)), _) => format!(", rtol {rtol:e}"),
            (Some(None), _) => ", to round-off".to_owned(),
            (None, Some(dt)) => format!(", dt {}", engineering(dt, "s")),
            (None, None) => String::new(),
        };
        if let (Some(velocity), Some(events)) = (&json.velocity, &json.events) {
            tuning.push_str(&format!(", {velocity} drag, {events} boundaries"));
        }
        line(&format!("  method   {}{tuning}", json.name));
        let mut outcome = flight.outcome.name().to_owned();
        if let (Some(margin), Some(bar)) = (flight.exit_margin, flight.exit_margin_error) {
            outcome.push_str(&if margin.is_finite() && bar.is_finite() {
                format!(" (exit margin {} +- {bar:.0e} of V0²)", significant(margin))
            } else {
                " (the exit margin leaves the range of 64-bit numbers)".to_owned()
            });
        }
        line(&format!("  outcome  {outcome}"));
        let groups = Groups::of(scene, problem.impact_speed);
        if let Some(g) = groups {
            let mut row = format!("  groups   I {}", impact_text(g.impact, problem.impact_speed));
            if let Some(n) = g.geometry {
                row.push_str(&format!("   N {}", significant(n)));
            }
            if let Some(h) = g.thickness_ratio {
                row.push_str(&format!("   H/d {}", significant(h)));
            }
            if let Some(d) = scene.diameter() {
                row.push_str(&format!("   X/d {}", significant(flight.end.depth / d)));
            }
            line(&row);
        }
        line("");
        let mut events = table(&["event", "time", "depth", "velocity"]);
        for e in &flight.events {
            let name = match e.kind {
                EventKind::StageEnd(index) => format!("stage-end {index}"),
                kind => kind.name().to_owned(),
            };
            events.add_row([
                name,
                engineering(e.state.time, "s"),
                engineering(e.state.depth, "m"),
                engineering(e.state.velocity, "m/s"),
            ]);
        }
        for row in table_lines(&events) {
            line(&row);
        }
        line("");
        match exact {
            Some(exact) => {
                let errors = RelativeErrorJson::new(flight, exact, problem.impact_speed);
                let mut rows = table(&["at the end", json.name, "closed form", "error"]);
                let error = |get: fn(&RelativeErrorJson) -> Option<f64>| error_text(errors.as_ref().and_then(get));
                let mut row = |name: &str, ours: f64, theirs: f64, unit: &str, error: String| {
                    rows.add_row([name.to_owned(), engineering(ours, unit), engineering(theirs, unit), error]);
                };
                row("depth", flight.end.depth, exact.end.depth, "m", error(|e| e.depth));
                row("time", flight.end.time, exact.end.time, "s", error(|e| e.time));
                row("velocity", flight.end.velocity, exact.end.velocity, "m/s", error(|e| e.velocity));
                for row in table_lines(&rows) {
                    line(&row);
                }
                if errors.is_none() {
                    line(&format!("  the closed form says {}", exact.outcome.name()));
                }
            }
            None => line("  no closed form for these stages: compare methods, or refine with `converge`"),
        }
        if let Some(limit) = flight.step_limit
            && !limit.stable
        {
            line(&format!("  the step lies beyond the stability limit {}", engineering(limit.limit, "s")));
        }
        line(&format!(
            "  cost     {} steps, {} rejected, {} force evaluations",
            flight.cost.steps, flight.cost.rejected_steps, flight.cost.force_evaluations
        ));
        if self.explain {
            line("");
            line("  skipped");
            for note in skipped {
                line(&wrapped("  - ", note));
            }
        }
        Ok(text)
    }
}

/// 3 beyond the scheme's step limit, 4 when undecided, else 0.
fn exit_of(flight: &Flight) -> Exit {
    if flight.step_limit.is_some_and(|l| !l.stable) {
        Exit::Criterion
    } else if flight.outcome == Outcome::Undecided {
        Exit::Undecided
    } else {
        Exit::Success
    }
}

/// The impact function for people; where the speed is above zero it is neither zero nor infinite, only out of range.
fn impact_text(impact: f64, impact_speed: f64) -> String {
    if impact == 0.0 && impact_speed > 0.0 {
        "below 1e-323".to_owned()
    } else if impact.is_infinite() {
        "above 1e308".to_owned()
    } else {
        significant(impact)
    }
}

/// `time_s,depth_m,velocity_m_s,force_n,stage`, one row a step and one an event.
fn trajectory_csv(flight: &Flight) -> String {
    let mut csv = String::from("time_s,depth_m,velocity_m_s,force_n,stage\n");
    for sample in &flight.trajectory {
        let s = sample.state;
        csv.push_str(&format!(
            "{},{},{},{},{}\n",
            Shown(s.time),
            Shown(s.depth),
            Shown(s.velocity),
            Shown(sample.force),
            sample.stage
        ));
    }
    csv
}
