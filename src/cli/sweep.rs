//! `penetrode sweep`: the paper's Figures 4 and 5, and the same along any number of a scene.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{print_json, print_text, significant, table, write_whole};
use super::solve::escape_terminal;
use super::{CliError, Exit, read_scene};
use crate::integrators::Method;
use crate::physics::{Criterion, Outcome};
use crate::report::figure::Figure;
use crate::report::sweep_figures;
use crate::studies::sweep::{Axis, Plan, Row, SweepError, explanation, read_points};

/// Rows of the table for people; all rows are in the CSV and the JSON.
const ROWS_SHOWN: usize = 24;

/// Arguments of `sweep`.
#[derive(Args, Debug)]
#[command(after_help = "PATH: projectile.mass, projectile.diameter, projectile.nose.factor, target.strength, \
    target.density, target.thickness, resistance.S, resistance.B, resistance.k, resistance.crater_stiffness, \
    impact.velocity, target.layer.0.strength and its like, stage.0.drag and its like; or a group: H/d moves the \
    thickness, I the velocity, N the density. A and B may have units: target.strength=20MPa:60MPa:5.\n\n\
    Where S follows Eq. 14 it is computed anew for each strength. Without impact velocity no flight is flown.\n\n\
    Files: --out F.csv writes the table and, beside it, F.svg (along H/d: Figure 4) and F-difference.svg (Figure 5).")]
pub struct SweepArgs {
    /// Scene file (TOML), or - for standard input.
    pub scene: String,
    /// What to vary: N values from A to B, both included. Once or twice; the last runs fastest.
    #[arg(long, value_name = "PATH=A:B:N[:log]", required = true)]
    pub vary: Vec<String>,
    /// Measured points for Figure 4: a CSV with the columns `H/d` and `E_c/(d3 fc)`.
    #[arg(long, value_name = "POINTS.csv")]
    pub data: Option<PathBuf>,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write the table to this CSV file and the figures beside it.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `sweep --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SweepJson {
    /// `penetrode/sweep/1`.
    pub schema: &'static str,
    /// Title of the scene.
    pub title: Option<String>,
    /// Method of the flights.
    pub method: MethodJson,
    /// Criterion of `critical_velocity_m_s` and `dimensionless_energy`: `full-depth` or `ndrc`.
    pub criterion: &'static str,
    /// What was varied, in the order of `values`.
    pub axes: Vec<AxisJson>,
    /// Whether S was computed anew from each strength (Eq. 14).
    pub static_factor_follows_strength: bool,
    /// The points; the last axis runs fastest.
    pub rows: Vec<RowJson>,
    /// Measured points beside the curves at the same H/d.
    pub data: Vec<DataJson>,
    /// Why the curves along H/d differ; empty along anything else.
    pub explanation: String,
    /// Rows without an answer.
    pub bad_rows: usize,
}

/// One axis.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AxisJson {
    /// Path of the number.
    pub path: String,
    /// First value, SI.
    pub from: f64,
    /// Last value, SI.
    pub to: f64,
    /// How many values.
    pub count: usize,
    /// Spaced by ratio.
    pub logarithmic: bool,
}

/// One point; `null` where there is no such value.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "the contract names every field with its unit")]
pub struct RowJson {
    pub values: Vec<f64>,
    pub outcome: Option<&'static str>,
    pub depth_m: Option<f64>,
    pub velocity_m_s: Option<f64>,
    pub critical_velocity_m_s: Option<f64>,
    pub critical_energy_j: Option<f64>,
    pub dimensionless_energy: Option<f64>,
    pub eq15_printed: Option<f64>,
    pub eq15_unrounded: Option<f64>,
    /// `dimensionless_energy` over `eq15_printed`, less one.
    pub difference_printed: Option<f64>,
    /// `dimensionless_energy` over `eq15_unrounded`, less one.
    pub difference_unrounded: Option<f64>,
    /// `E_c/(d³ fc)` with x = H, along H/d.
    pub energy_full_depth: Option<f64>,
    /// `E_c/(d³ fc)` with x = x_p(H), along H/d.
    pub energy_ndrc: Option<f64>,
    #[serde(rename = "H_over_d")]
    pub thickness_ratio: Option<f64>,
    #[serde(rename = "N")]
    pub geometry: Option<f64>,
    pub error: String,
}

/// A measured point and the curves there, all as `E_c/(d³ fc)`.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "named as the columns and curves")]
pub struct DataJson {
    #[serde(rename = "H_over_d")]
    pub thickness_ratio: f64,
    pub measured: f64,
    pub energy_full_depth: Option<f64>,
    pub energy_ndrc: Option<f64>,
    pub eq15_printed: Option<f64>,
}

impl From<&Row> for RowJson {
    fn from(row: &Row) -> Self {
        Self {
            values: row.values.to_vec(),
            outcome: row.flight.map(|f| f.outcome.name()),
            depth_m: row.flight.map(|f| f.depth),
            velocity_m_s: row.flight.map(|f| f.velocity),
            critical_velocity_m_s: row.critical_velocity,
            critical_energy_j: row.critical_energy,
            dimensionless_energy: row.dimensionless_energy,
            eq15_printed: row.eq15_printed,
            eq15_unrounded: row.eq15_unrounded,
            difference_printed: row.difference_printed(),
            difference_unrounded: row.difference_unrounded(),
            energy_full_depth: row.energy_full_depth,
            energy_ndrc: row.energy_ndrc,
            thickness_ratio: row.thickness_ratio,
            geometry: row.geometry,
            error: row.error.clone(),
        }
    }
}

impl From<SweepError> for CliError {
    fn from(error: SweepError) -> Self {
        Self::Usage { message: error.to_string(), help: error.help() }
    }
}

impl SweepArgs {
    /// Runs the sweep, writes its files, and prints it.
    ///
    /// # Errors
    /// A scene, axes, data or options that cannot be used (exit 2), a file that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        if let Some(path) = &self.out {
            refuse_parquet(path)?;
        }
        let scene = read_scene(&self.scene)?;
        let axes: Vec<Axis> = self.vary.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        if axes.len() > 2 {
            return Err(CliError::usage("--vary may be given once or twice", "sweep the third number in another run"));
        }
        let plan = Plan::new(scene, &axes)?;
        let method = self.method.build()?;
        let points = self.points(&plan)?;
        let rows = plan.run(method.integrator());
        let data = beside(&plan, &points, &method)?;
        let report = self.report(&plan, &rows, data)?;
        if let Some(path) = &self.out {
            write_files(path, &plan, &rows, &points)?;
        }
        if self.json { print_json(&report) } else { print_text(&self.text(&plan, &rows, &report)) }
            .map_err(CliError::stdout)?;
        for note in notes(&plan, &rows) {
            eprintln!("{note}");
        }
        Ok(if report.bad_rows > 0 { Exit::Criterion } else { Exit::Success })
    }

    fn points(&self, plan: &Plan) -> Result<Vec<(f64, f64)>, CliError> {
        let Some(path) = &self.data else { return Ok(Vec::new()) };
        if !plan.is_along_thickness() {
            return Err(CliError::usage(
                "measured points stand over H/d, and this sweep does not run along it",
                "sweep H/d alone, or leave out --data",
            ));
        }
        read_data(path)
    }

    fn report(&self, plan: &Plan, rows: &[Row], data: Vec<DataJson>) -> Result<SweepJson, CliError> {
        Ok(SweepJson {
            schema: "penetrode/sweep/1",
            title: plan.scene().title.clone(),
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            criterion: match plan.scene().criterion {
                Criterion::FullDepth => "full-depth",
                Criterion::Ndrc => "ndrc",
            },
            axes: plan
                .axes()
                .iter()
                .map(|axis| AxisJson {
                    path: axis.parameter.to_string(),
                    from: axis.from,
                    to: axis.to,
                    count: axis.count,
                    logarithmic: axis.logarithmic,
                })
                .collect(),
            static_factor_follows_strength: plan.moves_static_factor(),
            rows: rows.iter().map(RowJson::from).collect(),
            data,
            explanation: explanation(plan, rows),
            bad_rows: rows.iter().filter(|row| !row.error.is_empty()).count(),
        })
    }

    fn text(&self, plan: &Plan, rows: &[Row], report: &SweepJson) -> String {
        let mut lines = Vec::new();
        if let Some(title) = &report.title {
            lines.push(escape_terminal(title));
        }
        let paths: Vec<_> = report.axes.iter().map(|axis| axis.path.as_str()).collect();
        lines.push(format!("  {} points over {}, criterion {}", rows.len(), paths.join(" and "), report.criterion));
        if report.static_factor_follows_strength {
            lines.push("  S follows the strength by Eq. 14".to_owned());
        }
        lines.push(String::new());
        let mut header: Vec<String> = paths.iter().map(|path| format!("  {path}")).collect();
        header.extend(
            ["V_c [m/s]", "E_c/(d³ fc)", "Eq. 15", "over it", "outcome", "depth [m]", "V [m/s]"].map(str::to_owned),
        );
        let mut shown = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
        let dash = |value: Option<f64>| value.map_or("-".to_owned(), significant);
        // Evenly, first and last among them.
        let count = rows.len().min(ROWS_SHOWN);
        for i in 0..count {
            let row = &rows[if count < 2 { 0 } else { i * (rows.len() - 1) / (count - 1) }];
            let mut cells: Vec<String> = row.values.iter().map(|value| format!("  {}", significant(*value))).collect();
            if row.error.is_empty() {
                cells.extend([
                    dash(row.critical_velocity),
                    dash(row.dimensionless_energy),
                    dash(row.eq15_printed),
                    row.difference_printed().map_or("-".to_owned(), |d| format!("{:+.1} %", 100.0 * d)),
                    row.flight.map_or("-", |f| f.outcome.name()).to_owned(),
                    dash(row.flight.map(|f| f.depth)),
                    dash(row.flight.map(|f| f.velocity)),
                ]);
            } else {
                cells.push(row.error.clone());
            }
            shown.add_row(cells);
        }
        lines.extend(shown.to_string().lines().map(|line| line.trim_end().to_owned()));
        if count < rows.len() {
            lines.push(format!("  {count} of {} points shown; --out and --json give all", rows.len()));
        }
        if !report.data.is_empty() {
            let mut measured = table(&["  measured at H/d", "E_c/(d³ fc)", "full depth", "ndrc", "Eq. 15"]);
            for point in &report.data {
                measured.add_row([
                    format!("  {}", significant(point.thickness_ratio)),
                    significant(point.measured),
                    dash(point.energy_full_depth),
                    dash(point.energy_ndrc),
                    dash(point.eq15_printed),
                ]);
            }
            lines.push(String::new());
            lines.extend(measured.to_string().lines().map(|line| line.trim_end().to_owned()));
        }
        if !report.explanation.is_empty() {
            lines.push(String::new());
            lines.push(wrapped(&report.explanation, 100));
        }
        if let Some(path) = &self.out {
            lines.push(String::new());
            let names: Vec<_> = figure_paths(path, plan).iter().map(|p| p.display().to_string()).collect();
            lines.push(format!("  written: {}, {}", path.display(), names.join(", ")));
        }
        lines.push(String::new());
        lines.join("\n")
    }
}

/// Measured points of the file at `path`.
pub(super) fn read_data(path: &Path) -> Result<Vec<(f64, f64)>, CliError> {
    let text = std::fs::read_to_string(path)
        .map_err(|cause| CliError::usage(format!("cannot read {}: {cause}", path.display()), ""))?;
    read_points(&text).map_err(|error| {
        CliError::usage(
            format!("{}: {error}", path.display()),
            "give a CSV with the columns `H/d` and `E_c/(d3 fc)`, one number each a line",
        )
    })
}

/// `text` in lines of at most `width` characters, indented by two.
pub(super) fn wrapped(text: &str, width: usize) -> String {
    let mut lines = vec![String::from(" ")];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("  {word}")),
        }
    }
    lines.join("\n")
}

/// Refuses a table that this program cannot write.
fn refuse_parquet(path: &Path) -> Result<(), CliError> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet")) {
        return Err(CliError::usage(format!("{}: this build writes CSV only", path.display()), "name a .csv file"));
    }
    Ok(())
}

/// The curves at the measured points, computed there and not interpolated.
fn beside(plan: &Plan, points: &[(f64, f64)], method: &Method) -> Result<Vec<DataJson>, CliError> {
    let mut data = Vec::with_capacity(points.len());
    for &(ratio, measured) in points {
        let axis = Axis {
            parameter: crate::studies::parameter::Parameter::ThicknessRatio,
            from: ratio,
            to: ratio,
            count: 1,
            logarithmic: false,
        };
        let there = Plan::new(plan.scene().clone(), &[axis])?.run(method.integrator());
        for row in there {
            data.push(DataJson {
                thickness_ratio: ratio,
                measured,
                energy_full_depth: row.energy_full_depth,
                energy_ndrc: row.energy_ndrc,
                eq15_printed: row.eq15_printed,
            });
        }
    }
    Ok(data)
}

/// Where the figures go, beside the table at `path`.
fn figure_paths(path: &Path, plan: &Plan) -> Vec<PathBuf> {
    let mut paths = vec![path.with_extension("svg")];
    if draws_eq15(plan) {
        let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        paths.push(path.with_file_name(format!("{stem}-difference.svg")));
    }
    paths
}

/// Whether the figures are the paper's: along the thickness of one concrete.
fn draws_eq15(plan: &Plan) -> bool {
    plan.is_along_thickness() && plan.scene().concrete().is_some_and(|concrete| concrete.layers.is_empty())
}

/// Writes table and figures; every one is drawn before the first is written.
fn write_files(path: &Path, plan: &Plan, rows: &[Row], points: &[(f64, f64)]) -> Result<(), CliError> {
    let figures = if draws_eq15(plan) {
        vec![sweep_figures::critical_energy(rows, points), sweep_figures::critical_energy_difference(rows)]
    } else {
        vec![sweep_figures::critical_velocity(plan, rows)]
    };
    let failed = |path: &Path, cause| CliError::Write { path: path.display().to_string(), cause };
    let draw = |figure: Option<Figure>| figure.map(Figure::draw).transpose();
    let figures: Vec<_> = figures
        .into_iter()
        .map(draw)
        .collect::<Result<_, _>>()
        .map_err(|error| failed(path, std::io::Error::other(error)))?;
    let csv = csv_of(plan, rows).map_err(|cause| failed(path, cause))?;
    let write = |path: &Path, bytes: &[u8]| write_whole(path, bytes).map_err(|cause| failed(path, cause));
    write(path, &csv)?;
    for (figure_path, figure) in figure_paths(path, plan).iter().zip(figures) {
        match figure {
            Some(figure) => write(figure_path, figure.file().as_bytes())?,
            // A sweep of bad rows has a table, and nothing to draw.
            None => eprintln!("warning: {} not written: no point in its range", figure_path.display()),
        }
    }
    Ok(())
}

/// The table: the columns of the contract, then those that it allows to add.
fn csv_of(plan: &Plan, rows: &[Row]) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header: Vec<String> = plan.axes().iter().map(|axis| axis.parameter.to_string()).collect();
    header.extend(
        [
            "outcome",
            "depth_m",
            "velocity_m_s",
            "critical_velocity_m_s",
            "critical_energy_j",
            "dimensionless_energy",
            "eq15_printed",
            "eq15_unrounded",
            "error",
            "difference_printed",
            "difference_unrounded",
            "energy_full_depth",
            "energy_ndrc",
        ]
        .map(str::to_owned),
    );
    writer.write_record(&header)?;
    // `Display` of f64 is the shortest text that reads back to the same number.
    let text = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    for row in rows {
        let mut cells: Vec<String> = row.values.iter().map(ToString::to_string).collect();
        cells.push(row.flight.map_or("", |f| f.outcome.name()).to_owned());
        cells.extend([
            text(row.flight.map(|f| f.depth)),
            text(row.flight.map(|f| f.velocity)),
            text(row.critical_velocity),
            text(row.critical_energy),
            text(row.dimensionless_energy),
            text(row.eq15_printed),
            text(row.eq15_unrounded),
            row.error.clone(),
            text(row.difference_printed()),
            text(row.difference_unrounded()),
            text(row.energy_full_depth),
            text(row.energy_ndrc),
        ]);
        writer.write_record(&cells)?;
    }
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

/// What a reader of standard error should know: bad and undecided rows, and H/d beyond the relation.
fn notes(plan: &Plan, rows: &[Row]) -> Vec<String> {
    let mut notes = Vec::new();
    let bad = rows.iter().filter(|row| !row.error.is_empty()).count();
    if bad > 0 {
        notes.push(format!("warning: {bad} of {} points have no answer; the column `error` says why", rows.len()));
    }
    let undecided = |row: &&Row| row.flight.is_some_and(|f| f.outcome == Outcome::Undecided);
    let undecided = rows.iter().filter(undecided).count();
    if undecided > 0 {
        notes.push(format!("note: {undecided} of {} flights are undecided", rows.len()));
    }
    let end = crate::physics::semi_empirical::NDRC_END;
    let beyond = rows.iter().filter(|row| row.thickness_ratio.is_some_and(|ratio| ratio > end)).count();
    if beyond > 0 && (plan.scene().criterion == Criterion::Ndrc || plan.is_along_thickness()) {
        notes.push(format!("warning: {beyond} points lie beyond the end of the perforation relation, H/d = {end}"));
    }
    notes
}
