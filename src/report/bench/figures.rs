//! The figures of `bench`: error against time and against work, error against the step, cost as work grows.

use std::fmt::Display;

use super::BenchJson;
use crate::integrators::{Boundaries, MethodName, VelocityAt};
use crate::report::chart::{Axis, Panel, Point, Style};
use crate::report::figure::Figure;
use crate::report::figures::words_for;
use crate::report::text::{count, one_line};
use crate::studies::bench::growth::Growth;
use crate::studies::bench::step_size::StepStudy;
use crate::studies::bench::work_precision::{Contender, Run, RunState, variant_name};
use crate::suite::grouped;

/// Series in one panel at most, besides the one that stands in all: more cannot be distinguished.
const SERIES_MAX: usize = 7;

/// The series that stands in every panel, for comparison.
const IN_ALL: &str = "taylor";

/// Errors below this are drawn there: zero has no place on a logarithmic axis.
const LEAST: f64 = 1e-17;

/// Where runs without a right answer stand.
const FAILED_AT: f64 = 30.0;

/// Every figure of `report`.
pub(super) fn all(report: &BenchJson) -> Vec<Figure> {
    let mut figures = Vec::new();
    for case in &report.scenes {
        figures.extend(work_precision(report, &case.name));
    }
    figures.extend(report.step_size.iter().filter_map(step_size));
    figures.extend(growth(&report.growth));
    figures
}

/// What an accuracy costs: in words, its unit, and of one run.
type Cost = (&'static str, &'static str, fn(&Run) -> Option<f64>);

const COSTS: [Cost; 2] = [
    ("time", "µs", |run| run.time.map(|time| 1e-3 * time.median_ns).filter(|time| *time > 0.0)),
    ("force evaluations", "", |run| run.force_evaluations.filter(|count| *count > 0.0)),
];

/// What sets the figure of `study` apart from others of its kind.
pub(super) fn step_figure_of(study: &StepStudy) -> String {
    format!("{}-{}", study.scene, study.quantity.name())
}

fn work_precision(report: &BenchJson, scene: &str) -> Option<Figure> {
    let runs: Vec<&Run> = report.runs.iter().filter(|run| run.scene == scene).collect();
    let timed = runs.iter().filter(|run| run.time.is_some());
    let mut methods: Vec<&str> = timed.map(|run| run.method.as_str()).collect();
    methods.dedup();
    let groups = groups(&methods);
    // Other programs may not count their work: a panel needs more than the series that stands in all.
    let is_known = |group: &[&str], cost: &Cost| {
        let others = runs.iter().filter(|run| run.method != IN_ALL && group.contains(&run.method.as_str()));
        others.into_iter().any(|run| cost.2(run).is_some())
    };
    let panels = COSTS
        .iter()
        .flat_map(|cost| groups.iter().filter(|group| is_known(&group.1, cost)).map(|group| panel(&runs, group, cost)))
        .collect();
    let failed = runs.iter().filter(|run| run.state != RunState::Right).count();
    Figure::new("cost", scene, &[], &[&one_line(scene), &count(failed, "run")], panels)
}

/// Methods that share a panel: those of the program itself, those of diffsol, other programs.
fn groups<'a>(methods: &[&'a str]) -> Vec<(&'static str, Vec<&'a str>)> {
    let own: Vec<String> = Contender::all().into_iter().map(Contender::name).collect();
    let kind = |method: &str| match method.parse::<MethodName>() {
        Ok(name) => usize::from(name.needs_diffsol()),
        Err(_) => 2 * usize::from(!own.iter().any(|known| known == method)),
    };
    let mut groups = Vec::new();
    for (wanted, title) in ["own methods", "diffsol", "other programs"].into_iter().enumerate() {
        let of_kind: Vec<&str> =
            methods.iter().copied().filter(|method| *method != IN_ALL && kind(method) == wanted).collect();
        groups.extend(of_kind.chunks(SERIES_MAX).map(|chunk| {
            (title, methods.iter().copied().filter(|method| *method == IN_ALL || chunk.contains(method)).collect())
        }));
    }
    groups
}

fn panel(runs: &[&Run], (title, methods): &(&str, Vec<&str>), (words, unit, cost): &Cost) -> Panel {
    // The same range in all panels of a unit, whatever methods they show.
    let costs = Axis::log(&format!("{words} of a solution"), unit).including(runs.iter().filter_map(|run| cost(run)));
    let errors = Axis::log("relative error", "").from(LEAST).over([LEAST / 3.0, 3.0 * FAILED_AT]);
    let mut panel = Panel::new(format!("{title}, {words}"), costs, errors);
    for (series, method) in methods.iter().enumerate() {
        let points = |is_right: bool| {
            let mine =
                runs.iter().filter(move |run| run.method == *method && (run.state == RunState::Right) == is_right);
            let error = move |run: &Run| if is_right { run.error.unwrap_or(0.0) } else { FAILED_AT };
            mine.filter_map(move |run| Some((cost(run)?, error(run)))).collect::<Vec<Point>>()
        };
        let style = Style::marked_line(series);
        // Around the marks of the method that it chose.
        let style = if *method == MethodName::Adaptive.name() { style.hollow().radius(5.0) } else { style };
        panel = panel.series(one_line(method), style, points(true)).unlisted(
            format!("{method}, not right"),
            Style::marks(series).hollow(),
            points(false),
        );
    }
    panel
}

fn step_size(study: &StepStudy) -> Option<Figure> {
    // One step without error, by luck, leaves the others their height: it stands a decade below them.
    let curves = study.curves.iter().filter(|curve| !curve.adaptive);
    let errors = curves.flat_map(|curve| &curve.points).filter_map(|point| point.error);
    let least = 0.1 * errors.filter(|error| *error > 0.0).fold(1.0, f64::min);
    let panel = |velocity| {
        let errors = Axis::log("relative error", "").from(least);
        let panel = Panel::new(format!("{velocity} velocity"), Axis::log("time step", "s"), errors);
        Boundaries::ALL.into_iter().enumerate().fold(panel, |panel, (index, boundaries)| {
            let name = variant_name(velocity, boundaries);
            let curves = study.curves.iter().filter(|curve| !curve.adaptive && curve.method == name);
            let points = curves.flat_map(|curve| &curve.points);
            let points = points.filter_map(|point| Some((point.size, point.error?)));
            panel.series(boundaries.to_string(), Style::nested(index), points)
        })
    };
    let of = step_figure_of(study);
    let values = [&one_line(&study.scene) as &dyn Display, &words_for(study.quantity)];
    Some(Figure::new("steps", &of, &[], &values, VelocityAt::ALL.map(panel).into())?.sharing_axes())
}

fn growth(growth: &[Growth]) -> Option<Figure> {
    let mut by_threads = grouped(growth, |g| g.threads);
    by_threads.sort_unstable_by_key(|(threads, _)| *threads);
    let panel = |title, y: Axis, of: fn(&Growth) -> Option<f64>| {
        let panel = Panel::new(title, Axis::log("scenes", ""), y);
        by_threads.iter().enumerate().fold(panel, |panel, (index, (threads, members))| {
            let points = members.iter().filter_map(|g| Some((g.scenes as f64, of(g)?)));
            panel.series(count(usize::from(*threads), "thread"), Style::marked_line(index), points)
        })
    };
    let time = Axis::log("time for each scene", "µs");
    let memory = Axis::linear("peak memory", "MB").including([0.0]);
    let panels =
        vec![panel("time", time, |g| Some(g.microseconds_a_scene())), panel("memory", memory, Growth::peak_megabytes)];
    Figure::new("growth", "", &[], &[], panels)
}
