//! `penetrode audit`: order, error band and verdict for step-size results that another code produced.

use std::path::PathBuf;

use clap::Args;

use super::output::{Text, escape_terminal, interval_text, significant};
use super::runs::RunArgs;
use super::{Answer, Ask, CliError, Settings};
use crate::exchange::input::{is_standard, name_of};
use crate::exchange::tables::read_bytes;
use crate::physics::{Problem, Scene};
use crate::studies::audit::{Audit, ExactValues, QuantityAudit, RESULTS, Table, audit};
use crate::studies::critical_velocity;
use crate::studies::error::Truth;
use crate::studies::error::{is_fixed, value_of};
use crate::studies::quantity::Quantity;
use crate::studies::scheme_of_table::identify;
use crate::text::or_dash;

/// Arguments of `audit`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode audit results.csv --scene slab.toml --order 2")]
#[command(mut_arg("set", |set| set.requires("scene")))]
pub struct AuditArgs {
    /// CSV with dt_s and any of depth_m, time_s, velocity_m_s, crater_end_time_s, crater_end_velocity_m_s,
    /// critical_velocity_m_s, or with other units (dt_us, depth_mm), and other columns of numbers; - for standard input.
    #[arg(required_unless_present = "runs", conflicts_with = "runs")]
    pub results: Option<PathBuf>,
    /// Runs in place of a table.
    #[command(flatten)]
    pub runs: RunArgs,
    /// Scene whose exact answer the results must approach.
    #[arg(long)]
    pub scene: Option<String>,
    /// What is set in it.
    #[command(flatten)]
    pub settings: Settings,
    /// Formal order of the code; without it any order above zero converges.
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    pub order: Option<f64>,
}

impl Ask for AuditArgs {
    type Answer = Audit;

    fn ask(&self) -> Result<Answer<Audit>, CliError> {
        if self.results.as_deref().is_some_and(is_standard) && self.scene.as_deref() == Some("-") {
            return Err(CliError::usage(
                "the results and the scene cannot both come from standard input",
                "name a file for one",
            ));
        }
        let scene = self.scene.as_deref().map(|path| self.settings.read_problem(path)).transpose()?;
        let (file, results) = match &self.results {
            Some(path) => (name_of(path), Table::read(&name_of(path), &read_bytes(path, &RESULTS)?)?),
            None => {
                let exit_depth = scene.as_ref().map(|(_, problem)| problem.exit_depth);
                (format!("{} runs", self.runs.runs.len()), self.runs.table(exit_depth)?)
            }
        };
        let exact = scene.as_ref().map(|(scene, problem)| exact_values(scene, problem)).transpose()?;
        let mut judged = audit(&results, self.order, exact)?;
        judged.scheme = scene.and_then(|(_, problem)| identify(&problem, &results));
        Ok(Answer { text: text(&file, &judged), exit: judged.verdict.into(), data: Some(judged) })
    }
}

/// What the scene gives exactly.
fn exact_values(scene: &Scene, problem: &Problem) -> Result<ExactValues, CliError> {
    let exact = Truth::of(problem)?.flight;
    let values = Quantity::ALL.map(|quantity| match quantity {
        Quantity::CriticalVelocity => critical_velocity::exact_or_refined(scene).ok(),
        fixed if is_fixed(fixed, &exact) => None,
        free => value_of(free, &exact),
    });
    Ok(ExactValues { impact_velocity: problem.impact_speed, values })
}

fn text(file: &str, judged: &Audit) -> String {
    let mut text = Text::titled(Some(file));
    text.gap();
    let header = ["quantity", "order", "95 % interval", "limit", "error band", "class", "verdict"];
    let row = |q: &QuantityAudit| {
        [
            escape_terminal(q.quantity.name()),
            or_dash(q.observed_order, |order| format!("{order:.2}")),
            interval_text(q.interval),
            or_dash(q.limit, significant),
            or_dash(q.error_bands.first().map(|band| band.half_width), |half| format!("{half:.1e}")),
            q.class.name().to_owned(),
            q.verdict.name().to_owned(),
        ]
    };
    text.table(&header, judged.quantities.iter().map(row));
    text.gap();
    for q in &judged.quantities {
        text.wrapped("  ", &escape_terminal(&format!("{}: {}", q.quantity.name(), q.reason)));
        for band in &q.error_bands {
            text.wrapped("    ", &format!("+- {:.2e} by {}", band.half_width, band.rule));
        }
        if let (Some(exact), Some(agrees)) = (q.exact, q.agrees_with_exact) {
            let word = if agrees { "agrees with" } else { "misses" };
            text.line(format!("    the limit {word} the exact {}", significant(exact)));
        }
    }
    for finding in &judged.findings {
        text.wrapped("  note: ", &escape_terminal(&finding.message));
    }
    if let Some(scheme) = &judged.scheme {
        text.wrapped("  scheme     ", &scheme.sentence());
    }
    text.line(format!("  verdict    {}", judged.verdict.name()));
    text.finish()
}
