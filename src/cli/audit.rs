//! `penetrode audit`: order, error band and verdict for step-size results that another code produced.

use std::path::{Path, PathBuf};

use clap::Args;

use super::output::{Text, escape_terminal, interval_text, significant};
use super::report_args::ReportArgs;
use super::runs::RunArgs;
use super::{Answer, Ask, CliError, Settings};
use crate::exchange::input::{is_standard, name_of};
use crate::exchange::scene_file::SceneFile;
use crate::exchange::tables::read_bytes;
use crate::integrators::Flight;
use crate::physics::Problem;
use crate::report::environment::hash;
use crate::report::refinement::{PathMet, Refinement};
use crate::studies::audit::{Audit, ErrorBand, Exact, ExactValues, FormalOrders, QuantityAudit, RESULTS, Table, audit};
use crate::studies::critical_velocity;
use crate::studies::enclosure;
use crate::studies::error::Truth;
use crate::studies::error::{is_fixed, value_of};
use crate::studies::grid_convergence::ThreeGrids;
use crate::studies::quantity::Quantity;
use crate::studies::scheme_of_table::identify;
use crate::text::{digits_text, or_dash};

/// Arguments of `audit`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode audit results.csv --scene tunnel --order 2")]
#[command(mut_arg("set", |set| set.requires("scene")))]
pub struct AuditArgs {
    /// CSV with steps and values, such as dt_s,depth_m; - for standard input.
    ///
    /// Columns are dt_s and any of depth_m, time_s, velocity_m_s, crater_end_time_s, crater_end_velocity_m_s,
    /// critical_velocity_m_s, in these or other units (dt_us, depth_mm), and others of numbers.
    #[arg(required_unless_present = "runs", conflicts_with = "runs")]
    pub results: Option<PathBuf>,
    /// Runs in place of a table.
    #[command(flatten)]
    pub runs: RunArgs,
    /// Scene whose exact answer the results must approach.
    ///
    /// A file, or the name of a scene that ships.
    #[arg(long)]
    pub scene: Option<String>,
    /// What is set in it.
    #[command(flatten)]
    pub settings: Settings,
    /// Formal order of the code: 2, or depth=2,time=1.
    ///
    /// Of all quantities or of each; without it any order above zero converges.
    #[arg(long, value_name = "P", allow_hyphen_values = true)]
    pub order: Option<FormalOrders>,
    /// Where the report goes.
    #[command(flatten)]
    pub report: ReportArgs,
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
        let runs = self.runs.runs.iter().map(|(path, _)| path.as_path());
        let inputs = runs.chain(self.results.as_deref()).chain(self.scene.as_deref().map(Path::new));
        self.report.check("audit", &inputs.collect::<Vec<_>>())?;
        let scene = self.scene.as_deref().map(|path| self.settings.read_file_and_problem(path)).transpose()?;
        let file = self.results.as_deref().map_or_else(|| format!("{} runs", self.runs.runs.len()), name_of);
        let (results, hashed) = if let Some(path) = &self.results {
            let bytes = read_bytes(path, &RESULTS)?;
            (Table::read(&file, &bytes)?, ("Table (BLAKE3)", hash(&bytes)))
        } else {
            let table = self.runs.table(scene.as_ref().map(|(_, problem)| problem.exit_depth))?;
            let hashed = hash(format!("{table:?}"));
            (table, ("Ends of the runs, as they were read (BLAKE3)", hashed))
        };
        let flight = scene.as_ref().map(|(_, problem)| Truth::of(problem)).transpose()?.map(|truth| truth.flight);
        let exact = scene.as_ref().zip(flight.as_ref());
        let exact = exact.map(|((scene, problem), flight)| exact_values(scene, problem, flight));
        let scheme = scene.as_ref().and_then(|(_, problem)| identify(problem, &results));
        let judged = audit(&results, &self.order.clone().unwrap_or_default(), exact.as_ref(), scheme)?;
        let written = self.report.write(&judged, |environment| {
            let name = self.scene.as_deref().map(|path| name_of(Path::new(path)));
            let path = scene.as_ref().zip(flight.as_ref());
            let path = path.map(|((file, problem), flight)| PathMet::of(problem, &file.scene, flight));
            let exact = exact.map(|exact| ("Exact values (BLAKE3)", hash(format!("{exact:?}"))));
            let inputs = [hashed].into_iter().chain(exact).collect();
            Refinement::of_audit(&judged, &file, name.as_deref().zip(path), environment, inputs).report()
        })?;
        Ok(Answer { text: text(&file, &judged) + &written, exit: judged.verdict.into(), data: Some(judged) })
    }
}

/// What the scene gives exactly.
fn exact_values(file: &SceneFile, problem: &Problem, exact: &Flight) -> ExactValues {
    let SceneFile { scene, written } = file;
    let values = Quantity::ALL.map(|quantity| match value_of(quantity, exact) {
        Some(value) if is_fixed(quantity, exact) => Exact::Fixed(value),
        Some(value) => Exact::Free(value),
        None if quantity != Quantity::CriticalVelocity => Exact::Absent("the projectile does not reach x = k d"),
        None if !problem.has_exit() => Exact::Absent("the target has no far side"),
        None => critical_velocity::exact_or_refined(scene).map_or(Exact::Unknown, Exact::Free),
    });
    let proved = enclosure::quantities(scene, written).unwrap_or_default();
    ExactValues { impact_velocity: problem.impact_speed, stops: exact.outcome.is_stop(), values, proved }
}

fn text(file: &str, judged: &Audit) -> String {
    let mut text = Text::titled(Some(file));
    text.gap();
    let header = ["quantity", "finest value", "+-", "order", "95 % interval", "verdict"];
    let row = |q: &QuantityAudit| {
        [
            escape_terminal(q.quantity.name()),
            value_text(q.finest.value, q.error_band),
            or_dash(q.error_band.map(|band| band.half_width), |half| format!("{half:.1e}")),
            or_dash(q.observed_order, |order| format!("{order:.2}")),
            interval_text(q.interval),
            q.verdict.name().to_owned(),
        ]
    };
    text.table(&header, judged.quantities.iter().map(row));
    for q in &judged.quantities {
        quantity_text(&mut text, q);
    }
    text.gap();
    for finding in &judged.findings {
        match &finding.quantity {
            None => text.wrapped("  note: ", &escape_terminal(&finding.message)),
            // A column that is left out has no part of its own.
            Some(column) if judged.quantities.iter().all(|q| q.quantity != *column) => {
                text.wrapped("  note: ", &escape_terminal(&format!("{}: {}", column.name(), finding.message)));
            }
            Some(_) => {}
        }
    }
    if let Some(scheme) = &judged.scheme {
        text.wrapped("  scheme     ", &scheme.sentence());
    }
    text.line(format!("  verdict    {}", judged.verdict.name()));
    text.finish()
}

/// `value` with the digits that its error bar leaves.
fn value_text(value: f64, band: Option<ErrorBand>) -> String {
    let digits = band.map_or(6.0, |band| (value.abs() / band.half_width).log10().ceil() + 2.0);
    digits_text(value, digits.clamp(4.0, 15.0) as i32)
}

/// What is known of one column, its reason first.
fn quantity_text(text: &mut Text, q: &QuantityAudit) {
    let unit = q.quantity.quantity().map_or(String::new(), |quantity| format!(" {}", quantity.unit()));
    text.part(format!("{}: {}, {}", escape_terminal(q.quantity.name()), q.class.name(), q.verdict.name()));
    text.wrapped("  ", &escape_terminal(&q.reason));
    if let Some(advice) = &q.advice {
        text.wrapped("  to decide it: ", advice);
    }
    if let Some(band) = q.error_band {
        let value = value_text(q.finest.value, q.error_band);
        let percent = 100.0 * band.half_width / q.finest.value.abs();
        let percent = if percent.is_finite() { format!(" ({} %)", digits_text(percent, 2)) } else { String::new() };
        let half = band.half_width;
        let step = significant(q.finest.dt_s);
        text.wrapped("  ", &format!("{value}{unit} +- {half:.2e}{unit}{percent} at dt = {step} s: {}", band.rule));
    }
    let shown = |value| value_text(value, q.error_band);
    if let (Some(limit), Some(exact)) = (q.limit, q.exact) {
        let word = match q.agrees_with_exact {
            Some(true) => "agrees with",
            Some(false) => "misses",
            None => "is too unsure to compare with",
        };
        text.wrapped("  ", &format!("limit {}{unit}: {word} the exact {}{unit}", shown(limit), shown(exact)));
    } else if let Some(limit) = q.limit {
        text.line(format!("  limit {}{unit}", shown(limit)));
    }
    if let Some(proof) = &q.proof {
        text.wrapped("  ", proof);
    }
    if q.local_orders.len() > 1 {
        let shown = q.local_orders.iter().take(8).map(|order| or_dash(*order, |order| format!("{order:.2}")));
        text.wrapped(
            "  ",
            &format!("order of each three rows, finest first: {}", shown.collect::<Vec<_>>().join("  ")),
        );
    }
    if let Some(three) = &q.three_grids {
        three_grids_text(text, three, unit.trim(), q.error_band);
    }
    for band in &q.error_bands {
        let digits = format!("{:.2e}{unit}", band.half_width);
        text.wrapped("  ", &format!("+- {digits} by {}, order {:.2}", band.rule, band.order));
    }
}

/// The table of a grid convergence study, in its usual names.
fn three_grids_text(text: &mut Text, three: &ThreeGrids, unit: &str, band: Option<ErrorBand>) {
    let percent = |share: Option<f64>| or_dash(share, |share| format!("{} %", digits_text(100.0 * share, 3)));
    let row = |name: String, [a, b, c]: [String; 3]| [name, a, b, c];
    let name = if unit.is_empty() { "f".to_owned() } else { format!("f ({unit})") };
    text.table(
        &["", "1", "2", "3"],
        [
            row("h (s)".to_owned(), three.steps.map(significant)),
            row(name, three.values.map(|value| value_text(value, band))),
        ],
    );
    let order = or_dash(three.order, |order| format!("{order:.3}"));
    let [r21, r32] = three.ratios;
    let extrapolated = or_dash(three.extrapolated, |value| value_text(value, band));
    let ratio = or_dash(three.asymptotic_ratio, |ratio| format!("{ratio:.4}"));
    let (error, index) = (percent(three.approximate_error), percent(three.grid_convergence_index));
    text.wrapped(
        "  ",
        &format!(
            "r21 {r21:.3}, r32 {r32:.3}, p {order}, extrapolated {extrapolated}, e_a {error}, GCI {index}, asymptotic \
             ratio {ratio}: {}",
            three.rule
        ),
    );
}
