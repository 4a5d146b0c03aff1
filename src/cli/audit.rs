//! `penetrode audit`: order, error band and verdict for step-size results that another code produced.

use std::path::PathBuf;

use clap::Args;

use super::output::{escape_terminal, is_standard, print_json, print_text, significant, table, table_lines, wrapped};
use super::{CliError, Exit, problem_of, read_scene};
use crate::exchange::tables::{name_of, read_bytes};
use crate::physics::Problem;
use crate::studies::audit::{Audit, ExactValues, Expectation, RESULTS, Table, Verdict, audit};
use crate::studies::convergence::Yardstick;
use crate::studies::critical_velocity;
use crate::studies::error::{is_fixed, value_of};
use crate::studies::quantity::Quantity;

/// Arguments of `audit`.
#[derive(Args, Debug)]
pub struct AuditArgs {
    /// CSV with dt_s and any of depth_m, time_s, velocity_m_s, crater_end_time_s, crater_end_velocity_m_s,
    /// critical_velocity_m_s; - for standard input.
    pub results: PathBuf,
    /// Scene whose exact answer the results must approach.
    #[arg(long)]
    pub scene: Option<String>,
    /// Formal order of the code; without it any order above zero converges.
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    pub order: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

impl AuditArgs {
    /// Judges the table and prints the judgement.
    ///
    /// # Errors
    /// A table or a scene that cannot be used (exit 2).
    pub fn run(&self) -> Result<Exit, CliError> {
        if is_standard(&self.results) && self.scene.as_deref() == Some("-") {
            return Err(CliError::usage(
                "the results and the scene cannot both come from standard input",
                "name a file for one",
            ));
        }
        let file = name_of(&self.results);
        let bytes = read_bytes(&self.results, &RESULTS)?;
        let results = Table::read(&file, &bytes)?;
        let exact = self.scene.as_deref().map(exact_values).transpose()?;
        let judged = audit(&results, &Expectation { order: self.order, exact })?;
        if self.json { print_json(&judged) } else { print_text(&text(&file, &judged)) }.map_err(CliError::stdout)?;
        Ok(match judged.verdict {
            Verdict::Passed => Exit::Success,
            Verdict::Failed => Exit::Criterion,
            Verdict::Undecided => Exit::Undecided,
        })
    }
}

/// What the scene at `path` gives exactly.
fn exact_values(path: &str) -> Result<ExactValues, CliError> {
    let scene = read_scene(path)?;
    let problem: Problem = problem_of(&scene, path)?;
    let exact = Yardstick::of(&problem)?.flight;
    let values = Quantity::ALL.map(|quantity| match quantity {
        Quantity::CriticalVelocity => critical_velocity::exact_or_refined(&scene).ok(),
        fixed if is_fixed(fixed, &exact) => None,
        free => value_of(free, &exact),
    });
    Ok(ExactValues { impact_velocity: problem.impact_speed, values })
}

fn text(file: &str, judged: &Audit) -> String {
    let mut lines = vec![escape_terminal(file), String::new()];
    let mut rows = table(&["quantity", "order", "95 % interval", "limit", "error band", "class", "verdict"]);
    let verdict = |verdict: Verdict| match verdict {
        Verdict::Passed => "passed",
        Verdict::Undecided => "undecided",
        Verdict::Failed => "failed",
    };
    for q in &judged.quantities {
        let band = q.error_bands.first();
        rows.add_row([
            q.quantity.name().to_owned(),
            q.observed_order.map_or("-".to_owned(), |p| format!("{p:.2}")),
            q.interval.map_or("-".to_owned(), |[low, high]| format!("{low:.2} .. {high:.2}")),
            q.limit.map_or("-".to_owned(), significant),
            band.map_or("-".to_owned(), |b| format!("{:.1e}", b.half_width)),
            q.class.name().to_owned(),
            verdict(q.verdict).to_owned(),
        ]);
    }
    lines.extend(table_lines(&rows));
    lines.push(String::new());
    for q in &judged.quantities {
        lines.push(wrapped("  ", &format!("{}: {}", q.quantity.name(), q.reason)));
        for band in &q.error_bands {
            lines.push(wrapped("    ", &format!("+- {:.2e} by {}", band.half_width, band.rule)));
        }
        if let (Some(exact), Some(agrees)) = (q.exact, q.agrees_with_exact) {
            let word = if agrees { "agrees with" } else { "misses" };
            lines.push(format!("    the limit {word} the exact {}", significant(exact)));
        }
    }
    for finding in &judged.findings {
        lines.push(wrapped("  note: ", &escape_terminal(&finding.message)));
    }
    lines.push(format!("  verdict    {}", verdict(judged.verdict)));
    lines.push(String::new());
    lines.join("\n")
}
