//! `penetrode critical`: V_c and E_c by argmin, closed form and Eq. 15 beside them.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{
    engineering, error_text, escape_terminal, print_json, print_text, significant, table, table_lines, tell, wrapped,
};
use super::scene_json::SceneJson;
use super::{CliError, Exit, read_scene};
use crate::physics::semi_empirical::{eq15_printed, eq15_printed_validity, eq15_unrounded, perforation_validity};
use crate::physics::{Criterion, Problem, Scene, Shown, groups};
use crate::studies::critical_velocity::{self, CriticalVelocity};
use crate::studies::sensitivity::{self, SensitivityError, Spread};
use crate::studies::{applicability, parameter::ParameterError};

/// Arguments of `critical`.
#[derive(Args, Debug)]
pub struct CriticalArgs {
    /// Scene file (TOML), or - for standard input.
    pub scene: String,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Relative standard deviation of an input, such as target.strength=5%; repeatable, for the uncertainty of V_c.
    #[arg(long, value_name = "PATH=REL")]
    pub spread: Vec<String>,
    /// Random scenes behind that uncertainty.
    #[arg(long, default_value_t = 100_000, requires = "spread", value_parser = clap::value_parser!(u32).range(2..=100_000_000))]
    pub samples: u32,
    /// Seed of the random scenes.
    #[arg(long, default_value_t = 1, requires = "spread")]
    pub seed: u64,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `critical --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct CriticalJson {
    pub schema: &'static str,
    pub scene: SceneJson,
    pub method: MethodJson,
    pub critical_velocity_m_s: f64,
    pub error_bar_m_s: Option<f64>,
    pub critical_energy_j: f64,
    pub dimensionless_energy: Option<f64>,
    pub evaluations: u32,
    pub note: &'static str,
    pub closed_form: Option<ClosedCriticalJson>,
    pub relative_error: Option<f64>,
    pub eq15: Option<Eq15Json>,
    /// Uncertainty of V_c from the spreads asked for; `null` without any.
    pub uncertainty: Option<UncertaintyJson>,
    /// What was asked for and not computed, and why.
    pub skipped: Vec<String>,
}

/// Uncertainty of V_c from stated input spreads.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "named as in the text, with its unit")]
pub struct UncertaintyJson {
    pub spreads: Vec<SpreadJson>,
    /// To first order, by the derivatives of V_c.
    pub first_order_m_s: f64,
    pub samples: usize,
    /// Random scenes that were not admissible, left out.
    pub inadmissible: usize,
    pub seed: u64,
    pub mean_m_s: f64,
    pub deviation_m_s: f64,
    /// Quantiles 2.5, 50 and 97.5 %.
    pub quantiles_m_s: [f64; 3],
}

/// One input's part in it.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SpreadJson {
    /// Path of the number.
    pub path: String,
    /// Its relative standard deviation.
    pub relative: f64,
    /// Its share in the variance of V_c, to first order.
    pub share: f64,
}

/// The exact critical velocity.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct ClosedCriticalJson {
    pub critical_velocity_m_s: f64,
    pub critical_energy_j: f64,
    pub dimensionless_energy: Option<f64>,
}

/// Eq. 15 as E_c/(d³ fc), beside the simulation.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Eq15Json {
    /// With the printed coefficients.
    pub printed: f64,
    /// With unrounded coefficients.
    pub unrounded: f64,
    /// Whether H/d lies in the range of the formula.
    pub valid: bool,
    /// What is to be known of that range.
    pub note: String,
}

impl Eq15Json {
    /// Eq. 15 for `scene`; `None` for stages, layers and semi-infinite targets.
    pub fn new(scene: &Scene) -> Option<Self> {
        let concrete = scene.concrete().filter(|c| c.layers.is_empty())?;
        let ratio = scene.thickness? / concrete.diameter;
        let (printed, unrounded) = (eq15_printed(ratio), eq15_unrounded(ratio));
        let range = eq15_printed_validity(ratio);
        let relation = perforation_validity(ratio);
        Some(Self {
            printed: concrete.static_factor * printed,
            unrounded: concrete.static_factor * unrounded,
            valid: range.valid && relation.valid,
            note: if range.valid { relation.note } else { range.note },
        })
    }
}

impl From<ParameterError> for CliError {
    fn from(error: ParameterError) -> Self {
        Self::Usage { message: error.to_string(), help: error.help() }
    }
}

impl From<SensitivityError> for CliError {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Resolve(error) => error.into(),
            SensitivityError::Flight(error) => error.into(),
            SensitivityError::Parameter(error) => error.into(),
            SensitivityError::NoInput => {
                Self::usage(error.to_string(), "leave its spread out: V_c is sought whatever the impact velocity")
            }
            SensitivityError::NoCritical(_) => {
                Self::Run { message: error.to_string(), help: String::new(), last: None }
            }
        }
    }
}

impl CriticalArgs {
    /// Finds the critical velocity and prints it.
    ///
    /// # Errors
    /// A scene without a thickness or options that cannot be used (exit 2), no finite V_c (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        let scene = read_scene(&self.scene)?;
        if scene.thickness.is_none() {
            return Err(CliError::usage(
                "a semi-infinite target has no critical velocity",
                "give the target a thickness: [target] thickness = \"180 mm\"",
            )
            .in_file(&self.scene));
        }
        let method = self.method.build()?;
        let spreads = sensitivity::spreads(&self.spread)?;
        let found = critical_velocity::of_scene(&scene, method.integrator())?;
        let exact = critical_velocity::exact(&scene).ok();
        if let Some(warning) = scene.exit_depth_warning() {
            tell("warning: ", &warning);
        }
        let problem = scene.resolve(found.velocity)?;
        for warning in applicability::warnings(&scene, found.velocity) {
            tell("warning: ", &warning);
        }
        let mut report = self.report(&scene, &problem, &found, exact)?;
        if !spreads.is_empty() {
            if exact == Some(0.0) || found.velocity == 0.0 {
                report
                    .skipped
                    .push("the uncertainty does not apply: V_c is 0, and no spread is relative to it".to_owned());
            } else {
                report.uncertainty = Some(self.uncertainty(&scene, &spreads)?);
            }
        }
        if self.json { print_json(&report) } else { print_text(&text(&scene, &report)) }.map_err(CliError::stdout)?;
        Ok(Exit::Success)
    }

    fn report(
        &self,
        scene: &Scene,
        problem: &Problem,
        found: &CriticalVelocity,
        exact: Option<f64>,
    ) -> Result<CriticalJson, CliError> {
        let dimensionless = |energy: f64| {
            scene.concrete().filter(|c| c.layers.is_empty()).map(|c| groups::dimensionless_energy(energy, c))
        };
        let energy = |velocity: f64| 0.5 * scene.mass * velocity * velocity;
        Ok(CriticalJson {
            schema: "penetrode/critical/1",
            scene: SceneJson::new(scene, problem),
            method: MethodJson::new(self.method.method, &self.method.options()?, Some(problem), None),
            critical_velocity_m_s: found.velocity,
            error_bar_m_s: found.error_bar,
            critical_energy_j: found.energy,
            dimensionless_energy: dimensionless(found.energy),
            evaluations: found.evaluations,
            note: found.note,
            closed_form: exact.map(|velocity| ClosedCriticalJson {
                critical_velocity_m_s: velocity,
                critical_energy_j: energy(velocity),
                dimensionless_energy: dimensionless(energy(velocity)),
            }),
            relative_error: exact
                .map(|exact| if found.velocity == exact { 0.0 } else { ((found.velocity - exact) / exact).abs() }),
            eq15: Eq15Json::new(scene),
            uncertainty: None,
            skipped: Vec::new(),
        })
    }

    fn uncertainty(&self, scene: &Scene, spreads: &[Spread]) -> Result<UncertaintyJson, CliError> {
        let found = sensitivity::uncertainty(scene, spreads, self.samples as usize, self.seed)?;
        Ok(UncertaintyJson {
            spreads: spreads
                .iter()
                .zip(&found.shares)
                .map(|(spread, &share)| SpreadJson {
                    path: spread.parameter.to_string(),
                    relative: spread.relative,
                    share,
                })
                .collect(),
            first_order_m_s: found.first_order,
            samples: found.samples,
            inadmissible: found.inadmissible,
            seed: self.seed,
            mean_m_s: found.mean,
            deviation_m_s: found.deviation,
            quantiles_m_s: found.quantiles,
        })
    }
}

fn text(scene: &Scene, report: &CriticalJson) -> String {
    let mut lines = Vec::new();
    if let Some(title) = &scene.title {
        lines.push(escape_terminal(title));
    }
    let criterion = match scene.criterion {
        Criterion::FullDepth => "x = H",
        Criterion::Ndrc => "x = x_p(H), the NDRC relation",
    };
    lines.push(format!("  method     {}, perforation at {criterion}", report.method.name));
    let bar = report.error_bar_m_s.map_or(String::new(), |bar| format!(" +- {}", error_text(Some(bar))));
    lines.push(format!(
        "  V_c        {}{bar} m/s, {} flights",
        Shown(report.critical_velocity_m_s),
        report.evaluations
    ));
    lines.push(format!("  E_c        {}", engineering(report.critical_energy_j, "J")));
    if !report.note.is_empty() {
        lines.push(wrapped("  note       ", report.note));
    }
    if let Some(exact) = &report.closed_form {
        let error = error_text(report.relative_error);
        lines.push(format!("  exact      {} m/s, relative error {error}", Shown(exact.critical_velocity_m_s)));
    }
    lines.extend(report.skipped.iter().map(|note| wrapped("  note       ", note)));
    if let Some(u) = &report.uncertainty {
        lines.push(format!("  spread     +- {:.4} m/s to first order", u.first_order_m_s));
        for part in &u.spreads {
            let (path, share) = (&part.path, 100.0 * part.share);
            lines.push(format!("             {path} {} %: {share:.1} % of the variance", 100.0 * part.relative));
        }
        let [low, median, high] = u.quantiles_m_s;
        lines.push(format!("  sampled    mean {:.4}, deviation {:.4} m/s", u.mean_m_s, u.deviation_m_s));
        lines.push(format!("             95 % within {low:.3} to {high:.3} m/s, median {median:.3}"));
        let left_out =
            if u.inadmissible > 0 { format!(", {} inadmissible left out", u.inadmissible) } else { String::new() };
        lines.push(format!("             {} random scenes, seed {}{left_out}", u.samples, u.seed));
    }
    if let (Some(ours), Some(eq15)) = (report.dimensionless_energy, &report.eq15) {
        let mut rows = table(&["E_c/(d³ fc)", "value", "simulation over it"]);
        rows.add_row(["simulation".to_owned(), significant(ours), String::new()]);
        let mut row = |name: &str, value: f64| {
            // A target without thickness needs no energy by either.
            let over = ours / value - 1.0;
            let over = match 100.0 * over {
                percent if !percent.is_finite() => "-".to_owned(),
                percent if percent.abs() < 1e6 => format!("{percent:+.1} %"),
                percent => format!("{percent:+.1e} %"),
            };
            rows.add_row([name.to_owned(), significant(value), over]);
        };
        row("Eq. 15, printed", eq15.printed);
        row("Eq. 15, unrounded", eq15.unrounded);
        lines.push(String::new());
        lines.extend(table_lines(&rows));
        if !eq15.valid {
            lines.push(wrapped("  ", &format!("Eq. 15 does not apply: {}", eq15.note)));
        }
    }
    lines.push(String::new());
    lines.join("\n")
}
