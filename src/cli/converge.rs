//! `penetrode converge`: order of convergence of every quantity, fitted and classified.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson, parse_time};
use super::output::{escape_terminal, print_json, print_text, table, table_lines, wrapped};
use super::{CliError, Exit, problem_of, read_scene};
use crate::integrators::Steps;
use crate::integrators::method::MethodName;
use crate::physics::{Problem, Scene, Shown};
use crate::studies::Quantity;
use crate::studies::convergence::{
    Ladder, POINTS_DEFAULT, QuantityStudy, STEPS_OVER_TIME, TOLERANCES, Yardstick, of_fixed_steps, of_tolerances,
    why_no_critical_velocity,
};
use crate::studies::order::{Class, Exclusion, OrderVerdict};

/// Arguments of `converge`.
#[derive(Args, Debug)]
pub struct ConvergeArgs {
    /// Scene file (TOML), or - for standard input.
    pub scene: String,
    /// Method of integration [default: central-difference].
    #[arg(long, value_enum, default_value_t = MethodName::CentralDifference)]
    pub method: MethodName,
    /// Velocity in the drag of central-difference [default: lagged].
    #[arg(long, value_enum)]
    pub velocity: Option<crate::integrators::VelocityAt>,
    /// Where central-difference sees boundaries and rest [default: step-end].
    #[arg(long, value_enum)]
    pub events: Option<crate::integrators::Boundaries>,
    /// Smallest and largest step, such as 10ns:10us [default: 1e-5 to 1e-2 of the flight's time].
    #[arg(long, value_name = "A:B")]
    pub dt: Option<String>,
    /// How many step sizes or tolerances.
    #[arg(long, default_value_t = POINTS_DEFAULT, value_parser = clap::value_parser!(u16).range(4..=10_000))]
    pub points: u16,
    /// Seed of the random sizes.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `converge --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field")]
pub struct ConvergeJson {
    pub schema: &'static str,
    pub title: Option<String>,
    pub method: MethodJson,
    pub seed: u64,
    /// `closed-form`, or `taylor` where no closed form exists.
    pub reference: &'static str,
    pub verdict: &'static str,
    pub quantities: Vec<QuantityJson>,
    /// What was not studied, and why.
    pub skipped: Vec<String>,
}

/// The convergence of one quantity.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field")]
pub struct QuantityJson {
    pub quantity: &'static str,
    pub formal_order: Option<f64>,
    pub observed_order: Option<f64>,
    pub interval: Option<[f64; 2]>,
    pub error_constant: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub work_order: Option<Option<f64>>,
    pub class: &'static str,
    pub verdict: &'static str,
    /// Why this class, or why there is no fit.
    pub reason: String,
    /// Runs with another outcome than the exact one.
    pub lost_runs: usize,
    pub points: Vec<PointJson>,
}

/// One run.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct PointJson {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dt_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rtol: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_evaluations: Option<u64>,
    pub error: f64,
    pub used: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excluded: Option<&'static str>,
}

impl ConvergeArgs {
    /// Runs the study and prints it.
    ///
    /// # Errors
    /// A scene or options that cannot be used (exit 2), a flight without an answer (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        let scene = read_scene(&self.scene)?;
        let problem = problem_of(&scene, &self.scene)?;
        let method =
            MethodArgs { method: self.method, rtol: None, dt: None, velocity: self.velocity, events: self.events };
        if self.method == MethodName::ClosedForm {
            return Err(CliError::usage("the closed form has no order of convergence", "choose an integrator"));
        }
        // Refuses options that the method does not use.
        method.build()?;
        let fixed = self.method == MethodName::CentralDifference;
        if self.dt.is_some() && !fixed {
            return Err(CliError::usage("only central-difference has a fixed step", "leave out --dt"));
        }
        let yardstick = Yardstick::of(&problem)?;
        if yardstick.flight.end.time <= 0.0 {
            return Err(CliError::usage(
                "the flight takes no time, and has no order of convergence",
                "give it a velocity and a target",
            )
            .in_file(&self.scene));
        }
        let studies = if fixed {
            let [from, to] = self.steps(yardstick.flight.end.time)?;
            of_fixed_steps(
                &scene,
                &problem,
                (self.velocity.unwrap_or_default(), self.events.unwrap_or_default()),
                Ladder { from, to, points: usize::from(self.points), seed: self.seed },
                true,
                &Steps::Uniform,
            )?
        } else {
            let [from, to] = TOLERANCES;
            of_tolerances(
                &problem,
                self.method,
                Ladder { from, to, points: usize::from(self.points), seed: self.seed },
            )?
        };
        let quantities: Vec<_> = studies.iter().map(|study| quantity_json(study, fixed)).collect();
        let exit = exit_of(&quantities);
        let report = ConvergeJson {
            schema: "penetrode/converge/1",
            title: scene.title.clone(),
            method: MethodJson::new(self.method, &method.options()?, None, None),
            seed: self.seed,
            reference: if yardstick.is_closed_form { "closed-form" } else { "taylor" },
            verdict: match exit {
                Exit::Success => "passed",
                Exit::Criterion => "failed",
                _ => "undecided",
            },
            quantities,
            skipped: if fixed { skipped(&scene)? } else { Vec::new() },
        };
        if self.json { print_json(&report) } else { print_text(&text(&scene, &problem, &report)) }
            .map_err(CliError::stdout)?;
        Ok(exit)
    }

    /// Smallest and largest step [s].
    fn steps(&self, flight_time: f64) -> Result<[f64; 2], CliError> {
        let Some(text) = &self.dt else {
            return Ok(STEPS_OVER_TIME.map(|share| share * flight_time));
        };
        let help = "write the smallest and the largest step, such as 10ns:10us";
        let (a, b) =
            text.split_once(':').ok_or_else(|| CliError::usage(format!("--dt {text} is not a range"), help))?;
        let time =
            |text: &str| parse_time(text).map_err(|cause| CliError::usage(format!("--dt {text}: {cause}"), help));
        let (a, b) = (time(a)?, time(b)?);
        if a > 0.0 && a < b && b.is_finite() {
            Ok([a, b])
        } else {
            Err(CliError::usage(format!("--dt {text}: the first must be above zero and below the second"), help))
        }
    }
}

/// The critical velocity, where the scene has none to study.
fn skipped(scene: &Scene) -> Result<Vec<String>, CliError> {
    let why = why_no_critical_velocity(scene)?;
    Ok(why.map(|why| format!("{} does not apply: {why}", Quantity::CriticalVelocity.name())).into_iter().collect())
}

fn quantity_json(study: &QuantityStudy, fixed: bool) -> QuantityJson {
    let work_order = (!fixed)
        .then(|| study.work.as_ref().and_then(|fit| fit.as_ref().ok()).and_then(|fit| fit.line).map(|line| line.order));
    match &study.fit {
        Ok(fit) => QuantityJson {
            quantity: study.quantity.name(),
            formal_order: study.formal,
            observed_order: fit.line.map(|line| line.order),
            interval: fit.line.map(|line| line.interval95),
            error_constant: fit.line.map(|line| line.error_constant),
            work_order,
            class: fit.class.name(),
            verdict: match study.formal.map_or(OrderVerdict::Undecided, |formal| fit.verdict(formal)) {
                // Proportionality is graded by class: a controller holds the error of a step, not of the flight.
                _ if !fixed && fit.class == Class::Converging => "passed",
                OrderVerdict::Pass => "passed",
                OrderVerdict::Fail => "failed",
                OrderVerdict::Undecided => "undecided",
            },
            reason: fit.reason.clone(),
            lost_runs: study.lost,
            points: fit
                .points
                .iter()
                .enumerate()
                .map(|(index, point)| PointJson {
                    dt_s: fixed.then_some(point.step),
                    rtol: (!fixed).then_some(point.step),
                    force_evaluations: study.evaluations.get(index).copied(),
                    error: point.error.abs(),
                    used: point.used,
                    excluded: point.excluded.map(|why| match why {
                        Exclusion::ZeroError => "zero-error",
                        Exclusion::RoundOffFloor => "round-off-floor",
                        Exclusion::PreAsymptotic => "pre-asymptotic",
                    }),
                })
                .collect(),
        },
        Err(error) => QuantityJson {
            quantity: study.quantity.name(),
            formal_order: study.formal,
            observed_order: None,
            interval: None,
            error_constant: None,
            work_order,
            class: Class::Undecided.name(),
            verdict: "undecided",
            reason: error.to_string(),
            lost_runs: study.lost,
            points: Vec::new(),
        },
    }
}

/// 3 if a quantity diverges or misses its formal order, else 4 if one is undecided, oscillating or at the floor.
fn exit_of(quantities: &[QuantityJson]) -> Exit {
    let any = |verdict: &str| quantities.iter().any(|q| q.verdict == verdict);
    if any("failed") {
        Exit::Criterion
    } else if any("undecided") || quantities.is_empty() {
        Exit::Undecided
    } else {
        Exit::Success
    }
}

fn text(scene: &Scene, problem: &Problem, report: &ConvergeJson) -> String {
    let mut lines = Vec::new();
    if let Some(title) = &scene.title {
        lines.push(escape_terminal(title));
    }
    let rules = match (&report.method.velocity, &report.method.events) {
        (Some(velocity), Some(events)) => format!(", {velocity} drag, {events} boundaries"),
        _ => String::new(),
    };
    lines.push(format!("  method     {}{rules}", report.method.name));
    lines.push(format!("  reference  {}, V0 = {} m/s", report.reference, Shown(problem.impact_speed)));
    lines.push(String::new());
    let mut rows = table(&["quantity", "formal", "found", "95 % interval", "constant", "used", "class"]);
    for q in &report.quantities {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2}"));
        let interval = q.interval.map_or("-".to_owned(), |[low, high]| format!("{low:.2} .. {high:.2}"));
        let used = q.points.iter().filter(|p| p.used).count();
        rows.add_row([
            q.quantity.to_owned(),
            number(q.formal_order),
            number(q.observed_order),
            interval,
            q.error_constant.map_or("-".to_owned(), |c| format!("{c:.1e}")),
            format!("{used}/{}", q.points.len() + q.lost_runs),
            q.class.to_owned(),
        ]);
    }
    lines.extend(table_lines(&rows));
    for q in report.quantities.iter().filter(|q| q.verdict != "passed") {
        lines.push(wrapped("  ", &format!("{}: {} ({})", q.quantity, q.verdict, q.reason)));
    }
    lines.extend(report.skipped.iter().map(|note| wrapped("  ", note)));
    lines.push(format!("  verdict    {}", report.verdict));
    lines.push(String::new());
    lines.join("\n")
}
