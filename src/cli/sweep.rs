//! `penetrode sweep`: the paper's Figures 4 and 5, and the same along any number of a scene.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{
    WIDTH, check_format, check_outputs, escape_terminal, is_standard, print_json, print_text, significant, table,
    table_lines, takes_standard_output, tell, wrapped, write_all,
};
use super::{CliError, Exit, read_scene};
#[cfg(feature = "parquet")]
use crate::exchange::tables::{Cells, Kind, parquet::ParquetWriter};
use crate::exchange::tables::{name_of, push_line, read_bytes};
use crate::integrators::Method;
use crate::physics::{Criterion, Outcome, Parameter};
use crate::report::sweep_figures;
use crate::studies::sweep::{Axis, COLUMNS, POINTS, Plan, Row, explanation, read_points};

/// Rows of the table for people; all rows are in the CSV and the JSON.
const ROWS_SHOWN: usize = 24;

/// Arguments of `sweep`.
#[derive(Args, Debug)]
#[command(after_help = "PATH: projectile.mass, projectile.diameter, projectile.nose.factor, target.strength, \
    target.density, target.thickness, resistance.S, resistance.B, resistance.k, resistance.crater_stiffness, \
    impact.velocity, target.layer.0.strength and its like, stage.0.drag and its like; or a group: H/d moves the \
    thickness, I the velocity, N the density. A and B may have units: target.strength=20MPa:60MPa:5.\n\n\
    Where S follows Eq. 14 it is computed anew for each strength. Without impact velocity only V_c is computed.\n\n\
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
    /// Write the table to this file (.csv or .parquet) and the figures beside it; - for standard output, without figures.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What `sweep --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SweepJson<'a> {
    /// `penetrode/sweep/1`.
    pub schema: &'static str,
    /// Title of the scene.
    pub title: Option<&'a str>,
    /// Method of solution.
    pub method: MethodJson,
    /// Criterion of `critical_velocity_m_s` and `dimensionless_energy`: `full-depth` or `ndrc`.
    pub criterion: &'static str,
    /// What was varied, in the order of `values`.
    pub axes: &'a [Axis],
    /// Whether S was computed anew from each strength (Eq. 14).
    pub static_factor_follows_strength: bool,
    /// The points; the last axis runs fastest.
    pub rows: &'a [Row],
    /// Measured points beside the curves at the same H/d.
    pub data: Vec<MeasuredPoint>,
    /// Why the curves along H/d differ; empty along anything else.
    pub explanation: String,
    /// Rows without an answer.
    pub bad_rows: usize,
}

/// A measured point and the curves there, all as `E_c/(d³ fc)`.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "named as the columns and curves")]
pub struct MeasuredPoint {
    #[serde(rename = "H_over_d")]
    pub thickness_ratio: f64,
    pub measured: f64,
    pub energy_full_depth: Option<f64>,
    pub energy_ndrc: Option<f64>,
    pub eq15_printed: Option<f64>,
}

impl SweepArgs {
    /// Runs the sweep, writes its files, and prints it.
    ///
    /// # Errors
    /// A scene, axes, data or options that cannot be used (exit 2), a file that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        if let Some(path) = &self.out {
            check_format(path)?;
        }
        let scene = read_scene(&self.scene)?;
        let axes: Vec<Axis> = self.vary.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        if axes.len() > 2 {
            return Err(CliError::usage("--vary may be given once or twice", "sweep the third number in another run"));
        }
        let plan = Plan::new(scene, &axes)?;
        let is_table_printed = takes_standard_output(self.out.as_deref(), self.json)?;
        self.check_outputs(&plan)?;
        let method = self.method.build()?;
        let points = self.points(&plan)?;
        let rows = plan.run(method.integrator());
        let data = beside(&plan, &points, &method)?;
        let report = self.report(&plan, &rows, data)?;
        if let Some(path) = &self.out {
            write_files(path, &plan, &rows, &points)?;
        }
        if !is_table_printed {
            if self.json { print_json(&report) } else { print_text(&self.text(&plan, &rows, &report)) }
                .map_err(CliError::stdout)?;
        }
        for (head, note) in notes(&plan, &rows) {
            tell(head, &note);
        }
        Ok(if report.bad_rows > 0 { Exit::Criterion } else { Exit::Success })
    }

    /// Table and figures replace neither the scene nor the measured points, nor one another.
    fn check_outputs(&self, plan: &Plan) -> Result<(), CliError> {
        let Some(out) = &self.out else { return Ok(()) };
        let mut inputs = vec![("the scene", Path::new(&self.scene))];
        inputs.extend(self.data.as_deref().map(|path| ("the measured points", path)));
        let figures = figure_paths(out, plan);
        let mut outputs = vec![("the table", out.as_path())];
        outputs.extend(figures.iter().map(|path| ("the figure", path.as_path())));
        check_outputs(&inputs, &outputs)
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

    fn report<'a>(&self, plan: &'a Plan, rows: &'a [Row], data: Vec<MeasuredPoint>) -> Result<SweepJson<'a>, CliError> {
        Ok(SweepJson {
            schema: "penetrode/sweep/1",
            title: plan.scene().title.as_deref(),
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            criterion: match plan.scene().criterion {
                Criterion::FullDepth => "full-depth",
                Criterion::Ndrc => "ndrc",
            },
            axes: plan.axes(),
            static_factor_follows_strength: plan.moves_static_factor(),
            rows,
            data,
            explanation: explanation(plan, rows),
            bad_rows: rows.iter().filter(|row| !row.error.is_empty()).count(),
        })
    }

    fn text(&self, plan: &Plan, rows: &[Row], report: &SweepJson<'_>) -> String {
        let mut lines = Vec::new();
        if let Some(title) = &report.title {
            lines.push(escape_terminal(title));
        }
        let paths: Vec<_> = report.axes.iter().map(|axis| axis.parameter.to_string()).collect();
        let over = format!("{} points over {}, criterion {}", rows.len(), paths.join(" and "), report.criterion);
        lines.push(wrapped("  ", &over));
        if report.static_factor_follows_strength {
            lines.push("  S follows the strength by Eq. 14".to_owned());
        }
        lines.push("  V_c and V in m/s, X in m, E_c over d³ fc; `over it` is E_c over Eq. 15".to_owned());
        lines.push(String::new());
        // Evenly, first and last among them.
        let count = rows.len().min(ROWS_SHOWN);
        let shown: Vec<&Row> =
            (0..count).map(|i| &rows[if count < 2 { 0 } else { i * (rows.len() - 1) / (count - 1) }]).collect();
        // A number broken in two lines reads as another number: columns that do not fit are left out.
        let fitting = (1..=TEXT_COLUMNS.len()).rev().map(|count| points_table(&paths, &shown, count));
        let is_within = |(lines, _): &(Vec<String>, _)| lines.iter().all(|line| line.chars().count() <= WIDTH);
        let mut tables = fitting.map(|(table, left_out)| (table_lines(&table), left_out));
        let narrowest = || points_table(&paths, &shown, 1);
        let (points, left_out) = tables.find(is_within).unwrap_or_else(|| {
            let (mut table, left_out) = narrowest();
            table.set_content_arrangement(comfy_table::ContentArrangement::Dynamic);
            (table_lines(&table), left_out)
        });
        lines.extend(points);
        if !left_out.is_empty() {
            lines.push(format!("  no room for {}; --out and --json give all", left_out.join(", ")));
        }
        if count < rows.len() {
            lines.push(format!("  {count} of {} points shown; --out and --json give all", rows.len()));
        }
        if !report.data.is_empty() {
            let mut measured = table(&["measured at H/d", "E_c/(d³ fc)", "full depth", "ndrc", "Eq. 15"]);
            let dash = |value: Option<f64>| value.map_or("-".to_owned(), significant);
            for point in &report.data {
                measured.add_row([
                    significant(point.thickness_ratio),
                    significant(point.measured),
                    dash(point.energy_full_depth),
                    dash(point.energy_ndrc),
                    dash(point.eq15_printed),
                ]);
            }
            lines.push(String::new());
            lines.extend(table_lines(&measured));
        }
        if !report.explanation.is_empty() {
            lines.push(String::new());
            lines.push(wrapped("  ", &report.explanation));
        }
        if let Some(path) = &self.out {
            lines.push(String::new());
            let mut names = vec![path.display().to_string()];
            names.extend(figure_paths(path, plan).iter().map(|p| p.display().to_string()));
            lines.push(wrapped("  written: ", &names.join(", ")));
        }
        lines.push(String::new());
        lines.join("\n")
    }
}

/// Measured points of the file at `path`.
pub(super) fn read_data(path: &Path) -> Result<Vec<(f64, f64)>, CliError> {
    Ok(read_points(&name_of(path), &read_bytes(path, &POINTS)?)?)
}

/// What a column of the table for people shows of a row; `None` where the row has no such value.
type Column = (&'static str, fn(&Row) -> Option<String>);

/// The columns behind the varied numbers.
const TEXT_COLUMNS: [Column; 7] = [
    ("V_c", |row| row.critical_velocity.map(significant)),
    ("E_c", |row| row.dimensionless_energy.map(significant)),
    ("Eq. 15", |row| row.eq15_printed.map(significant)),
    ("over it", |row| row.difference_printed.map(|d| format!("{:+.1} %", 100.0 * d))),
    ("ends", |row| row.outcome.map(|outcome| outcome.name().replace("stopped-in-", "in "))),
    ("X", |row| row.depth.map(significant)),
    ("V", |row| row.velocity.map(significant)),
];

/// The rows for people, with the first `count` columns behind the varied numbers, and the names of the others; a column
/// that no row fills is no column, nor is Eq. 15 where two numbers vary.
fn points_table(paths: &[String], rows: &[&Row], count: usize) -> (comfy_table::Table, Vec<&'static str>) {
    let is_shown =
        |(name, cell): &&Column| rows.iter().any(|row| cell(row).is_some()) && !(*name == "Eq. 15" && paths.len() > 1);
    let mut columns: Vec<&Column> = TEXT_COLUMNS.iter().filter(is_shown).collect();
    let left_out = columns.split_off(count.min(columns.len())).iter().map(|(name, _)| *name).collect();
    let mut header: Vec<&str> = paths.iter().map(|path| path.rsplit('.').next().unwrap_or(path)).collect();
    header.extend(columns.iter().map(|(name, _)| *name));
    let mut shown = table(&header);
    shown.set_content_arrangement(comfy_table::ContentArrangement::Disabled);
    for row in rows {
        let mut cells: Vec<String> = row.values.iter().map(|value| significant(*value)).collect();
        if row.error.is_empty() {
            cells.extend(columns.iter().map(|(_, cell)| cell(row).unwrap_or_else(|| "-".to_owned())));
        } else {
            cells.push("no answer".to_owned());
        }
        shown.add_row(cells);
    }
    (shown, left_out)
}

/// The curves at the measured points, computed there and not interpolated.
fn beside(plan: &Plan, points: &[(f64, f64)], method: &Method) -> Result<Vec<MeasuredPoint>, CliError> {
    let mut data = Vec::with_capacity(points.len());
    for &(ratio, measured) in points {
        let parameter = Parameter::ThicknessRatio;
        let axis = Axis { parameter, from: ratio, to: ratio, count: 1, logarithmic: false };
        let there = Plan::new(plan.scene().clone(), &[axis])?.run(method.integrator());
        data.extend(there.into_iter().map(|row| MeasuredPoint {
            thickness_ratio: ratio,
            measured,
            energy_full_depth: row.energy_full_depth,
            energy_ndrc: row.energy_ndrc,
            eq15_printed: row.eq15_printed,
        }));
    }
    Ok(data)
}

/// Where the figures go, beside the table at `path`.
fn figure_paths(path: &Path, plan: &Plan) -> Vec<PathBuf> {
    if is_standard(path) {
        return Vec::new();
    }
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
        vec![sweep_figures::critical_energy(rows, points, &[]), sweep_figures::critical_energy_difference(rows, &[])]
    } else {
        vec![sweep_figures::critical_velocity(plan, rows)]
    };
    #[cfg(feature = "parquet")]
    let bytes = if super::output::is_parquet(path) { parquet_of(plan, rows) } else { Ok(csv_of(plan, rows)) };
    #[cfg(not(feature = "parquet"))]
    let bytes = Ok(csv_of(plan, rows));
    let mut files = vec![(path.to_owned(), bytes.map_err(|cause| CliError::write(path, cause))?)];
    for (figure_path, figure) in figure_paths(path, plan).into_iter().zip(figures) {
        match figure {
            Some(figure) => files.push((figure_path, figure.file().into_bytes())),
            // A sweep of bad rows has a table, and nothing to draw.
            None => tell("warning: ", &format!("{} not written: no point in its range", figure_path.display())),
        }
    }
    write_all(&files)
}

fn csv_of(plan: &Plan, rows: &[Row]) -> Vec<u8> {
    let axes = plan.axes().iter().map(|axis| axis.parameter.to_string());
    let names: Vec<_> = axes.chain(COLUMNS.map(|(name, ..)| name.to_owned())).collect();
    let mut csv = names.join(",") + "\n";
    for row in rows {
        push_line(&mut csv, &row.cells());
    }
    csv.into_bytes()
}

#[cfg(feature = "parquet")]
fn parquet_of(plan: &Plan, rows: &[Row]) -> std::io::Result<Vec<u8>> {
    let paths: Vec<_> = plan.axes().iter().map(|axis| axis.parameter.to_string()).collect();
    let axes = paths.iter().map(|path| (path.as_str(), Kind::Number));
    let columns: Vec<_> = axes.chain(COLUMNS.map(|(name, kind, _)| (name, kind))).collect();
    let mut cells: Vec<_> = columns.iter().map(|(_, kind)| Cells::empty(*kind)).collect();
    for row in rows {
        cells.iter_mut().zip(row.cells()).for_each(|(column, cell)| column.push(cell));
    }
    let mut table = ParquetWriter::new(Vec::new(), &columns)?;
    table.push(cells)?;
    table.finish()
}

/// What a reader of standard error should know: bad and undecided rows, and H/d beyond the relation.
fn notes(plan: &Plan, rows: &[Row]) -> Vec<(&'static str, String)> {
    let mut notes = Vec::new();
    let bad = rows.iter().filter(|row| !row.error.is_empty()).count();
    if bad > 0 {
        notes.push((
            "warning: ",
            format!(
                "{bad} of {} points have no answer; `error` in --json, and in the table of --out, says why",
                rows.len()
            ),
        ));
    }
    let undecided = rows.iter().filter(|row| row.outcome == Some(Outcome::Undecided)).count();
    if undecided > 0 {
        notes.push(("note: ", format!("{undecided} of {} outcomes are undecided", rows.len())));
    }
    let end = crate::physics::semi_empirical::NDRC_END;
    let beyond = rows.iter().filter(|row| row.thickness_ratio.is_some_and(|ratio| ratio > end)).count();
    if beyond > 0 && (plan.scene().criterion == Criterion::Ndrc || plan.is_along_thickness()) {
        let text = format!("{beyond} points lie beyond the end of the perforation relation, H/d = {end}");
        notes.push(("warning: ", text));
    }
    notes
}
