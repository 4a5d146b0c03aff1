//! `penetrode sweep`: the paper's Figure 4, the difference from Eq. 15, and the same along any number of a scene.

use std::path::{Path, PathBuf};

use clap::Args;
use comfy_table::ContentArrangement;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{
    Text, WIDTH, check_format, check_table, figure_paths, is_parquet, say, significant, table, table_lines, write_table,
};
use super::{Answer, Ask, CliError, Exit, SceneArgs};
use crate::exchange::input::name_of;
use crate::exchange::scene_file::SceneFile;
use crate::exchange::tables::{self, Kind, read_bytes};
use crate::physics::semi_empirical::NDRC_END;
use crate::physics::{Criterion, Outcome};
use crate::report::sweep_figures;
use crate::studies::sweep::{
    Axis, Conclusion, MeasuredPoint, POINTS, Plan, Row, conclusions, explanation, read_points,
};
use crate::text::or_dash;

/// Rows of the table for people; all rows are in the CSV and the JSON.
const ROWS_SHOWN: usize = 24;

/// Arguments of `sweep`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/sweep.txt"))]
pub struct SweepArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What to vary, such as H/d=0.5:18:200; once or twice.
    ///
    /// N values from A to B, both included, with :log behind N in equal ratios; the last of two runs fastest.
    #[arg(long, value_name = "PATH=A:B:N", required = true)]
    pub vary: Vec<String>,
    /// Measured points for Figure 4.
    ///
    /// A CSV with the columns `H/d` and `E_c/(d3 fc)`.
    #[arg(long, value_name = "POINTS.csv")]
    pub data: Option<PathBuf>,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write the table to this file and figures beside it.
    ///
    /// A .csv or .parquet file; - is standard output, without figures.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
}

/// What `sweep --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SweepJson {
    /// `penetrode/sweep/1`.
    pub schema: &'static str,
    /// Title of the scene.
    pub title: Option<String>,
    /// Method of solution.
    pub method: MethodJson,
    /// Criterion of `critical_velocity_m_s` and `dimensionless_energy`: `full-depth` or `ndrc`.
    pub criterion: &'static str,
    /// What was varied, in the order of `values`.
    pub axes: Vec<Axis>,
    /// Whether S was computed anew from each strength (Eq. 14).
    pub static_factor_follows_strength: bool,
    /// Which numbers the scene does not state: they follow others at every point.
    pub follows: Vec<String>,
    /// The points; the last axis runs fastest.
    pub rows: Vec<Row>,
    /// Measured points beside the curves at the same H/d.
    pub data: Vec<MeasuredPoint>,
    /// Why the curves along H/d differ; empty along anything else.
    pub explanation: String,
    /// The paper's conclusions on its Figures 4 and 5, and whether they hold here; empty along anything but H/d.
    pub conclusions: Vec<Conclusion>,
    /// Rows without an answer.
    pub bad_rows: usize,
}

impl Ask for SweepArgs {
    type Answer = SweepJson;

    fn table(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn ask(&self) -> Result<Answer<SweepJson>, CliError> {
        self.table().map(check_format).transpose()?;
        let SceneFile { scene, written } = self.scene.settings.read_file(&self.scene.path)?;
        let axes: Vec<Axis> = self.vary.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        if axes.len() > 2 {
            return Err(CliError::usage("--vary may be given once or twice", "sweep the third number in another run"));
        }
        let plan = Plan::new(scene, &axes)?.of_written(written);
        // Table and figures replace neither the scene nor the measured points, nor one another.
        let mut inputs = vec![("the scene", Path::new(&self.scene.path))];
        inputs.extend(self.data.as_deref().map(|path| ("the measured points", path)));
        check_table(&inputs, self.table(), endings(&plan))?;
        let method = self.method.build()?;
        let points = self.points(&plan)?;
        let rows = plan.run(method.integrator());
        let beside = plan.beside(&points, method.integrator())?;
        let data = SweepJson {
            schema: "penetrode/sweep/1",
            title: plan.scene().title.clone(),
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            criterion: plan.scene().criterion.into(),
            axes,
            static_factor_follows_strength: plan.moves_static_factor(),
            follows: plan.follows(),
            conclusions: if draws_eq15(&plan) { conclusions(&rows, &beside) } else { Vec::new() },
            data: beside,
            explanation: explanation(&plan, &rows),
            bad_rows: rows.iter().filter(|row| !row.error.is_empty()).count(),
            rows,
        };
        if let Some(path) = &self.out {
            write_files(path, &plan, &data.rows, &data.data)?;
        }
        say_notes(&plan, &data);
        let exit = if data.bad_rows > 0 { Exit::Criterion } else { Exit::Success };
        Ok(Answer { text: self.text(&plan, &data), data: Some(data), exit })
    }
}

impl SweepArgs {
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

    fn text(&self, plan: &Plan, data: &SweepJson) -> String {
        let mut text = Text::titled(data.title.as_deref());
        let (rows, paths) = (&data.rows, plan.paths());
        text.wrapped(
            "  ",
            &format!("{} points over {}, criterion {}", rows.len(), paths.join(" and "), data.criterion),
        );
        data.follows.iter().for_each(|sentence| text.wrapped("  ", sentence));
        text.line("  V_c and V in m/s, X in m, E_c over d³ fc; `over it` is E_c over Eq. 15");
        text.gap();
        // Evenly, first and last among them.
        let count = rows.len().min(ROWS_SHOWN);
        let shown: Vec<&Row> =
            (0..count).map(|i| &rows[if count < 2 { 0 } else { i * (rows.len() - 1) / (count - 1) }]).collect();
        let (points, left_out) = points_table(&paths, &shown);
        text.lines(points);
        if !left_out.is_empty() {
            text.line(format!("  no room for {}; --out and --json give all", left_out.join(", ")));
        }
        if count < rows.len() {
            text.line(format!("  {count} of {} points shown; --out and --json give all", rows.len()));
        }
        if !data.data.is_empty() {
            text.gap();
            let point = |p: &MeasuredPoint| {
                let curves = [p.energy_full_depth, p.energy_ndrc, p.eq15_printed].map(|e| or_dash(e, significant));
                [significant(p.thickness_ratio), significant(p.measured)].into_iter().chain(curves).collect::<Vec<_>>()
            };
            let header = ["measured at H/d", "E_c/(d³ fc)", "full depth", "ndrc", "Eq. 15"];
            text.table(&header, data.data.iter().map(point));
        }
        if !data.explanation.is_empty() {
            text.gap();
            text.wrapped("  ", &data.explanation);
        }
        for Conclusion { statement, standing, reason } in &data.conclusions {
            text.wrapped("  - ", &format!("{statement}: {standing}; {reason}"));
        }
        if let Some(path) = &self.out {
            text.gap();
            let files = [path.clone()].into_iter().chain(figure_paths(path, endings(plan)));
            text.wrapped("  written: ", &files.map(|path| path.display().to_string()).collect::<Vec<_>>().join(", "));
        }
        text.finish()
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
    ("V_c", |row| row.critical_velocity_m_s.map(significant)),
    ("E_c", |row| row.dimensionless_energy.map(significant)),
    ("Eq. 15", |row| row.eq15_printed.map(significant)),
    ("over it", |row| row.difference_printed.map(|d| format!("{:+.1} %", 100.0 * d))),
    ("ends", |row| row.outcome.map(|outcome| outcome.name().replace("stopped-in-", "in "))),
    ("X", |row| row.depth_m.map(significant)),
    ("V", |row| row.velocity_m_s.map(significant)),
];

/// The lines of the table of `rows`, and the columns behind the varied numbers for which there is no room: a number
/// broken in two lines reads as another number.
///
/// A column that no row fills is no column, nor is Eq. 15 where two numbers vary.
fn points_table(paths: &[String], rows: &[&Row]) -> (Vec<String>, Vec<&'static str>) {
    let is_shown =
        |(name, cell): &&Column| rows.iter().any(|row| cell(row).is_some()) && !(*name == "Eq. 15" && paths.len() > 1);
    let columns: Vec<&Column> = TEXT_COLUMNS.iter().filter(is_shown).collect();
    let names: Vec<_> = columns.iter().map(|(name, _)| *name).collect();
    let lines_of = |count: usize, arrangement| {
        let keys = paths.iter().map(|path| path.rsplit('.').next().unwrap_or(path));
        let mut shown = table(&keys.chain(names[..count].iter().copied()).collect::<Vec<_>>());
        shown.set_content_arrangement(arrangement);
        for row in rows {
            let cells = columns[..count].iter().map(|(_, cell)| cell(row).unwrap_or_else(|| "-".to_owned()));
            let has_any = columns.iter().any(|(_, cell)| cell(row).is_some());
            let cells = cells.filter(|_| has_any).chain((!has_any).then(|| "no answer".to_owned()));
            shown.add_row(row.values.iter().copied().map(significant).chain(cells));
        }
        table_lines(&shown)
    };
    let is_within = |lines: &Vec<String>| lines.iter().all(|line| line.chars().count() <= WIDTH);
    for count in (1..=columns.len()).rev() {
        let lines = lines_of(count, ContentArrangement::Disabled);
        if is_within(&lines) {
            return (lines, names[count..].to_vec());
        }
    }
    let least = columns.len().min(1);
    (lines_of(least, ContentArrangement::Dynamic), names[least..].to_vec())
}

/// How the names of the figures beside the table end.
fn endings(plan: &Plan) -> &'static [&'static str] {
    if draws_eq15(plan) { &["", "-difference"] } else { &[""] }
}

/// Whether the figures are the paper's: along the thickness of one concrete.
fn draws_eq15(plan: &Plan) -> bool {
    plan.is_along_thickness() && plan.scene().concrete().is_some_and(|concrete| concrete.layers.is_empty())
}

/// Writes table and figures; every one is drawn before the first is written.
fn write_files(path: &Path, plan: &Plan, rows: &[Row], measured: &[MeasuredPoint]) -> Result<(), CliError> {
    let figures = if draws_eq15(plan) {
        let points: Vec<_> = measured.iter().map(|point| (point.thickness_ratio, point.measured)).collect();
        let difference = sweep_figures::critical_energy_difference(rows, measured, &[]);
        vec![sweep_figures::critical_energy(rows, &points, &[]), difference]
    } else {
        vec![sweep_figures::critical_velocity(plan, rows)]
    };
    let paths = plan.paths();
    let axes = paths.iter().map(|path| (path.as_str(), Kind::Number));
    let is_enclosed = rows.iter().any(|row| row.bounds.is_some());
    let columns: Vec<_> = axes.chain(Row::columns(is_enclosed)).collect();
    let table = tables::table_of(&columns, is_parquet(path), rows.iter().map(Row::cells));
    write_table(path, table, endings(plan), figures)
}

/// Says on standard error what a reader should know: bad and undecided rows, and H/d beyond the relation.
fn say_notes(plan: &Plan, data: &SweepJson) {
    let (rows, count) = (&data.rows, data.rows.len());
    if data.bad_rows > 0 {
        let why = "have no answer, or not all of it; `error` in --json, and in the table of --out, says why";
        say("warning: ", &format!("{} of {count} points {why}", data.bad_rows));
    }
    let undecided = rows.iter().filter(|row| row.outcome == Some(Outcome::Undecided)).count();
    if undecided > 0 {
        say("note: ", &format!("{undecided} of {count} outcomes are undecided"));
    }
    let beyond = rows.iter().filter(|row| row.thickness_ratio.is_some_and(|ratio| ratio > NDRC_END)).count();
    if beyond > 0 && (plan.scene().criterion == Criterion::Ndrc || plan.is_along_thickness()) {
        let what = "points lie beyond the end of the perforation relation";
        say("warning: ", &format!("{beyond} {what}, H/d = {NDRC_END}"));
    }
}
