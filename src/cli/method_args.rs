//! The options that choose and tune a method, shared by every command that integrates.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::CliError;
use crate::integrators::central_difference::{Boundaries, VelocityAt};
use crate::integrators::method::{Accuracy, Method, MethodName, MethodOptions, RTOL_DEFAULT};
use crate::integrators::{Flight, IntegrationError, StepLimit};
use crate::physics::Problem;
use crate::physics::units::{Dimension, quantity};
use crate::text::engineering;

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
        Ok(MethodOptions { rtol: self.rtol, dt, velocity: self.velocity, events: self.events })
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
            (None, Some(dt)) => format!(", dt {}", engineering(dt, "s")),
            (None, None) => String::new(),
        };
        format!("{}{tuning}{}", self.name, self.rules())
    }
}
