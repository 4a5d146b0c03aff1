//! The options that choose and tune a method, shared by every command that integrates.

use std::path::Path;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::CliError;
use crate::exchange::input::name_of;
use crate::exchange::tables::{self, Column, Format, Others, read_bytes};
use crate::integrators::central_difference::{Boundaries, Steps, VelocityAt};
use crate::integrators::method::{Accuracy, Method, MethodName, MethodOptions, RTOL_DEFAULT};
use crate::integrators::{Flight, IntegrationError, StepLimit};
use crate::physics::units::{Dimension, quantity};
use crate::physics::{Problem, Range};
use crate::text::{count, engineering};

/// Method and options.
#[derive(Args, Clone, Debug, Default)]
pub struct MethodArgs {
    /// Method of integration.
    #[arg(long, value_enum, default_value_t = MethodName::Taylor)]
    pub method: MethodName,
    /// Relative tolerance of methods that have one.
    #[arg(long, long_help = rtol_help(), value_name = "R", allow_hyphen_values = true)]
    pub rtol: Option<f64>,
    /// central-difference: time step, such as 1us.
    ///
    /// A number alone is in seconds; when left out, it follows from the stages.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub dt: Option<String>,
    /// central-difference: unequal steps, FILE.csv or auto:0.9.
    ///
    /// A table gives them in a column dt_s, taken in order and started over; auto is the rule of an explicit finite-element code, with a
    /// safety factor: times the shorter of 2/w and M/(r/2 + q V) of the present stage, the last step kept where neither exists.
    #[arg(long, value_name = "STEPS", conflicts_with = "dt")]
    pub steps: Option<String>,
    /// central-difference: V in the drag [default: lagged].
    ///
    /// The default is that of the paper.
    #[arg(long, value_enum)]
    pub velocity: Option<VelocityAt>,
    /// central-difference: boundaries [default: step-end].
    ///
    /// Where it sees stage ends, exit and rest; the default is that of the paper.
    #[arg(long, value_enum)]
    pub events: Option<Boundaries>,
}

/// Which methods have a tolerance, and what it is by default.
fn rtol_help() -> String {
    let names = |accuracy| {
        let is_own = |name: MethodName| !name.needs_diffsol() || name == MethodName::Adaptive;
        let of = |name: &&MethodName| name.accuracy() == accuracy && is_own(**name);
        MethodName::ALL.iter().filter(of).map(|name| name.name()).collect::<Vec<_>>().join(" and ")
    };
    let [to_tolerance, to_round_off] = [Accuracy::Tolerance, Accuracy::RoundOff].map(names);
    format!("Relative tolerance (diffsol methods and {to_tolerance}: {RTOL_DEFAULT:e}; {to_round_off}: round-off)")
}

impl MethodArgs {
    /// The options in SI units.
    ///
    /// # Errors
    /// When the step is not a time.
    pub fn options(&self) -> Result<MethodOptions, CliError> {
        let dt = self
            .dt
            .as_deref()
            .map(|text| time_option(text, "write a time such as \"1 us\", or seconds"))
            .transpose()?;
        let steps = self.steps.as_deref().map(steps_option).transpose()?;
        Ok(MethodOptions { rtol: self.rtol, dt, steps, velocity: self.velocity, events: self.events })
    }

    /// The method, ready to solve.
    ///
    /// # Errors
    /// Options that the method does not use or that are out of range.
    pub fn build(&self) -> Result<Method, CliError> {
        Method::new(self.method, &self.options()?).map_err(|error| match (error, &self.dt) {
            // The step as it was typed, `1 us` and not 1e-6.
            (IntegrationError::BadOption { option: "--dt", allowed, .. }, Some(typed)) => {
                IntegrationError::BadOption { option: "--dt", value: typed.clone(), allowed }.into()
            }
            (error, _) => error.into(),
        })
    }
}

/// A table of steps.
static STEPS: Format = Format {
    columns: &[Column::number("dt_s").measured("dt", Dimension::Time).within(Range::Positive)],
    others: Others::Ignored,
    has_comments: true,
};

/// Most steps of a table.
const STEPS_MAX: usize = 10_000_000;

/// The steps that were given to `--steps`: a table, `auto`, or `auto` with a safety factor.
fn steps_option(text: &str) -> Result<Steps, CliError> {
    let help = "name a table with a column dt_s, or write auto:0.9";
    if let Some(rest) = text.strip_prefix("auto").filter(|rest| rest.is_empty() || rest.starts_with(':')) {
        let safety = if rest.is_empty() { Ok(SAFETY_DEFAULT) } else { rest[1..].trim().parse::<f64>() };
        return match safety {
            Ok(safety) if safety > 0.0 && safety <= 1.0 => Ok(Steps::Automatic(safety)),
            _ => Err(CliError::usage(format!("--steps {text}: the safety factor is not above 0 and at most 1"), help)),
        };
    }
    let path = Path::new(text);
    let sizes = tables::read(&name_of(path), &read_bytes(path, &STEPS)?, &STEPS, |row| row.number(0))?;
    if sizes.len() > STEPS_MAX {
        return Err(CliError::usage(format!("--steps {text}: more than {STEPS_MAX} steps"), "they are started over"));
    }
    Ok(Steps::Given(sizes))
}

/// Safety factor of `--steps auto`.
const SAFETY_DEFAULT: f64 = 0.9;

/// The time (s) that was given to `--dt`.
///
/// # Errors
/// A text that is no time (exit 2), with `help`.
pub fn time_option(text: &str, help: &str) -> Result<f64, CliError> {
    let time = text.trim().parse().or_else(|_| quantity(text, Dimension::Time));
    time.map_err(|cause| CliError::usage(format!("--dt {text}: {cause}"), help))
}

/// `method` in the JSON of a command.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct MethodJson {
    /// Name of the method.
    pub name: &'static str,
    /// Relative tolerance; absent for fixed steps and closed forms, `null` for round-off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rtol: Option<Option<f64>>,
    /// Time step (s) of a fixed-step scheme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dt_s: Option<f64>,
    /// Unequal steps of a fixed-step scheme: `120 given steps`, `auto:0.9`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<String>,
    /// Velocity in the drag of a fixed-step scheme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<&'static str>,
    /// Boundary rule of a fixed-step scheme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub events: Option<&'static str>,
    /// Step limit of a fixed-step scheme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stability: Option<StepLimit>,
}

impl MethodJson {
    /// What was used for `problem`, and what `flight` says of its stability.
    pub fn new(name: MethodName, options: &MethodOptions, problem: Option<&Problem>, flight: Option<&Flight>) -> Self {
        let mut json = Self { name: name.name(), ..Self::default() };
        match name.accuracy() {
            Accuracy::Step => {
                json.dt_s = problem.map(|p| options.central_difference().time_step(p)).or(options.dt);
                json.steps = match &options.steps {
                    Some(Steps::Given(sizes)) => Some(count(sizes.len(), "given step")),
                    Some(Steps::Automatic(safety)) => Some(format!("auto:{safety}")),
                    _ => None,
                };
                json.velocity = Some(options.velocity.unwrap_or_default().name());
                json.events = Some(options.events.unwrap_or_default().name());
                json.stability = flight.and_then(|f| f.step_limit);
            }
            Accuracy::RoundOff => json.rtol = Some(options.rtol),
            Accuracy::Exact => {}
            Accuracy::Tolerance => json.rtol = Some(Some(options.rtol.unwrap_or(RTOL_DEFAULT))),
        }
        json
    }

    /// The rules of a fixed-step scheme, for people.
    pub fn rules(&self) -> String {
        let rules = self.velocity.zip(self.events);
        rules.map_or_else(String::new, |(velocity, events)| format!(", {velocity} drag, {events} boundaries"))
    }

    /// Name and options for people.
    pub fn text(&self) -> String {
        let tuning = match (self.rtol, self.dt_s) {
            (Some(Some(rtol)), _) => format!(", rtol {rtol:e}"),
            (Some(None), _) => ", to round-off".to_owned(),
            (None, Some(dt)) => match &self.steps {
                Some(steps) => format!(", {steps}"),
                None => format!(", dt {}", engineering(dt, "s")),
            },
            (None, None) => String::new(),
        };
        format!("{}{tuning}{}", self.name, self.rules())
    }
}
