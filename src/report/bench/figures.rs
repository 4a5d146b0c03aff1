//! The figures of `bench`: error against time and against work, error against the step, cost as work grows.

use super::BenchJson;
use crate::integrators::MethodName;
use crate::report::chart::{Axis, HEIGHT, Ink, Key, KeyPlace, Mark, Panel, RADIUS, Shape};
use crate::report::figure::{Figure, Part};
use crate::report::figures::words_for;
use crate::report::table::{Table, or_empty};
use crate::report::text::{count, one_line};
use crate::studies::Quantity;
use crate::studies::bench::growth::Growth;
use crate::studies::bench::step_size::{BOUNDARIES, Curve, StepStudy, VELOCITIES};
use crate::studies::bench::work_precision::{Contender, Run, RunState, variant_name};

/// Series in one panel at most, besides the one that stands in all: more cannot be told apart.
const SERIES_MAX: usize = 7;

/// The series that stands in every panel, for comparison.
const IN_ALL: &str = "taylor";

/// Room for the legend to the right of the points, over the width of the points on the logarithmic abscissa.
const ROOM: f64 = 0.7;

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
    figures.extend(report.step_size.iter().map(step_size));
    figures.extend(growth(&report.growth));
    figures
}

/// What an accuracy costs, in one unit.
struct Cost {
    label: &'static str,
    words: &'static str,
    of: fn(&Run) -> Option<f64>,
}

const COSTS: [Cost; 2] = [
    Cost {
        label: "time of a flight [µs]",
        words: "time",
        of: |run| run.time.map(|time| 1e-3 * time.median_ns).filter(|time| *time > 0.0),
    },
    Cost {
        label: "force evaluations of a flight",
        words: "force evaluations",
        of: |run| run.force_evaluations.filter(|count| *count > 0.0),
    },
];

/// Name of the figure that shows what an accuracy costs on `scene`.
pub(super) fn cost_figure_name(scene: &str) -> String {
    format!("cost-{}", file_name(scene))
}

/// Name of the figure of `study`.
pub(super) fn step_figure_name(study: &StepStudy) -> String {
    format!("steps-{}-{}", file_name(&study.scene), study.quantity.name().replace('_', "-"))
}

fn work_precision(report: &BenchJson, scene: &str) -> Option<Figure> {
    let runs: Vec<&Run> = report.runs.iter().filter(|run| run.scene == scene).collect();
    let timed = runs.iter().filter(|run| run.time.is_some());
    let mut methods: Vec<&str> = timed.map(|run| run.method.as_str()).collect();
    methods.dedup();
    if methods.is_empty() {
        return None;
    }
    let mut y = Axis::log("relative error", [LEAST]);
    y.range = [LEAST / 2.0, 3.0 * FAILED_AT];
    let groups = groups(&methods);
    let panels = COSTS
        .iter()
        .flat_map(|cost| groups.iter().map(|group| panel(&runs, group, cost, &y)).collect::<Vec<_>>())
        .collect();
    let mut table =
        Table::new(["method", "setting", "state", "error", "quantity", "time_us", "low_us", "high_us", "evaluations"]);
    for run in &runs {
        let time = |of: fn(&crate::studies::bench::Timing) -> f64| or_empty(run.time.as_ref().map(|t| 1e-3 * of(t)));
        table.push([
            &run.method,
            &run.setting,
            &run.state.name(),
            &or_empty(run.error),
            &run.quantity.map_or("", Quantity::name),
            &time(|t| t.median_ns),
            &time(|t| t.low_ns),
            &time(|t| t.high_ns),
            &or_empty(run.force_evaluations),
        ]);
    }
    let failed = runs.iter().filter(|run| run.state != RunState::Right).count();
    Some(Figure {
        name: cost_figure_name(scene),
        part: Part::Cost,
        message: format!("{}: error against time and against force evaluations", one_line(scene)),
        reading: format!(
            "Each point is a method at one setting; to the left is cheaper, below is more accurate. An error of zero \
             stands at 10⁻¹⁷; at the top, hollow, what is wrong or undecided: {}. ",
            count(failed, "run")
        ),
        claims: Vec::new(),
        panels,
        table,
    })
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

fn panel(runs: &[&Run], (title, methods): &(&str, Vec<&str>), cost: &Cost, y: &Axis) -> Panel {
    let (mut marks, mut keys) = (Vec::new(), Vec::new());
    let mut x = Axis::log(cost.label, runs.iter().filter_map(|run| (cost.of)(run)));
    x.range[1] *= (x.range[1] / x.range[0]).powf(ROOM);
    for (series, method) in methods.iter().enumerate() {
        // Four colours, then the same with another shape; the first is that of the series in all.
        let (ink, shape) = (Ink::series(series), if series < 4 { Shape::Circle } else { Shape::Triangle });
        let points = |state: &dyn Fn(RunState) -> bool, place: &dyn Fn(&Run) -> f64| -> Vec<(f64, f64)> {
            let mine = runs.iter().filter(|run| run.method == *method && state(run.state));
            mine.filter_map(|run| Some(((cost.of)(run)?, place(run)))).collect()
        };
        let right = points(&|state| state == RunState::Right, &|run| run.error.unwrap_or(LEAST).max(LEAST));
        let wrong = points(&|state| state != RunState::Right, &|_| FAILED_AT);
        marks.push(Mark::Line { points: right.clone(), ink, dashed: false });
        marks.push(Mark::Points { points: right, ink, shape, hollow: false, radius: RADIUS });
        marks.push(Mark::Points { points: wrong, ink, shape, hollow: true, radius: RADIUS });
        keys.push(Key { text: one_line(method), ink, shape: Some(shape), hollow: false });
    }
    Panel {
        title: format!("{title}, {}", cost.words),
        description: format!("Relative error against {} for {}.", cost.words, methods.join(", ")),
        x,
        y: y.clone(),
        marks,
        keys,
        key_place: KeyPlace::Corner,
        height: HEIGHT,
    }
}

fn step_size(study: &StepStudy) -> Figure {
    let mut table = Table::new(["method", "size", "error", "time_us"]);
    for curve in &study.curves {
        for point in &curve.points {
            let time = or_empty(point.time_ns.map(|ns| 1e-3 * ns));
            table.push([&curve.method, &point.size, &or_empty(point.error), &time]);
        }
    }
    let steps: Vec<&Curve> = study.curves.iter().filter(|curve| !curve.adaptive).collect();
    let all = || steps.iter().flat_map(|curve| &curve.points);
    let x = Axis::log("time step [s]", all().map(|point| point.size));
    let y = Axis::log("relative error", all().filter_map(|point| point.error).map(|error| error.max(LEAST)));
    let panels = VELOCITIES
        .into_iter()
        .map(|velocity| {
            let (mut marks, mut keys) = (Vec::new(), Vec::new());
            for (index, boundaries) in BOUNDARIES.into_iter().enumerate() {
                let (ink, shape) = (Ink::series(index), Shape::series(index));
                let name = variant_name(velocity, boundaries);
                let mine = steps.iter().filter(|curve| curve.method == name).flat_map(|curve| &curve.points);
                let points = mine.filter_map(|p| Some((p.size, p.error?.max(LEAST)))).collect();
                marks.push(Mark::Points { points, ink, shape, hollow: false, radius: 0.7 * RADIUS });
                keys.push(Key { text: boundaries.to_string(), ink, shape: Some(shape), hollow: false });
            }
            Panel {
                title: format!("{velocity} velocity"),
                description: format!("Error of the {} against the step.", words_for(study.quantity)),
                x: x.clone(),
                y: y.clone(),
                marks,
                keys,
                key_place: KeyPlace::Corner,
                height: HEIGHT,
            }
        })
        .collect();
    Figure {
        name: step_figure_name(study),
        part: Part::Cost,
        message: format!(
            "{}: error of the {} against the time step",
            one_line(&study.scene),
            words_for(study.quantity)
        ),
        reading:
            "The nine variants of the paper's scheme, from one step a flight downwards. Points that jump belong to \
                  boundaries seen at step ends: one of them may be small by luck. "
                .to_owned(),
        claims: Vec::new(),
        panels,
        table,
    }
}

fn growth(growth: &[Growth]) -> Option<Figure> {
    if growth.is_empty() {
        return None;
    }
    let mut threads: Vec<u16> = growth.iter().map(|g| g.threads).collect();
    threads.sort_unstable();
    threads.dedup();
    let mut table = Table::new(["scenes", "threads", "source", "seconds", "ns_a_scene", "peak_bytes"]);
    for g in growth {
        let peak = g.peak_bytes.map_or_else(String::new, |bytes| bytes.to_string());
        let source = format!("{:?}", g.source).to_lowercase();
        table.push([&g.scenes, &g.threads, &source, &g.seconds, &g.ns_a_scene, &peak]);
    }
    let micro = |g: &Growth| Some(1e-3 * g.ns_a_scene);
    let mega = |g: &Growth| g.peak_bytes.map(|bytes| 1e-6 * bytes as f64);
    let scenes = Axis::log("scenes", growth.iter().map(|g| g.scenes as f64));
    let panel = |title: &str, y: Axis, of: &dyn Fn(&Growth) -> Option<f64>| {
        let (mut marks, mut keys) = (Vec::new(), Vec::new());
        for (index, &number) in threads.iter().enumerate() {
            let (ink, shape) = (Ink::series(index), Shape::series(index));
            let mine = growth.iter().filter(|g| g.threads == number);
            let points: Vec<_> = mine.filter_map(|g| Some((g.scenes as f64, of(g)?))).collect();
            marks.push(Mark::Line { points: points.clone(), ink, dashed: false });
            marks.push(Mark::Points { points, ink, shape, hollow: false, radius: RADIUS });
            keys.push(Key { text: count(usize::from(number), "thread"), ink, shape: Some(shape), hollow: false });
        }
        Panel {
            title: title.to_owned(),
            description: format!("{} against the number of scenes.", y.label),
            x: scenes.clone(),
            y,
            marks,
            keys,
            key_place: KeyPlace::Head,
            height: HEIGHT,
        }
    };
    Some(Figure {
        name: "growth".to_owned(),
        part: Part::Cost,
        message: "Cost of a batch as work grows".to_owned(),
        reading: "Time of the whole process over the number of scenes, and its peak memory. From files to a million \
                  scenes, beyond from the generator. "
            .to_owned(),
        claims: Vec::new(),
        panels: vec![
            panel("time", Axis::log("time a scene [µs]", growth.iter().filter_map(micro)), &micro),
            panel("memory", Axis::linear("peak memory [MB]", growth.iter().filter_map(mega).chain([0.0])), &mega),
        ],
        table,
    })
}

/// A name of a file from the name of a scene: letters, digits and hyphens.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}
