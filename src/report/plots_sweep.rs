//! The figures of sweeps, of the map of Eq. 11-12, and of measured depths, as SVG text.
//!
//! Each function returns a whole SVG of fixed size, the same text for the same data. The colours are those below: one
//! place for a page that wants others.

use std::fmt::Display;

use plotters::coord::Shift;
use plotters::prelude::*;
use thiserror::Error;

use crate::studies::applicability::{self, LEVELS};
use crate::studies::sweep::{Plan, Row};

/// Width and height of a figure [px].
const SIZE: (u32, u32) = (860, 560);

/// Simulation with x = H.
const BLUE: RGBColor = RGBColor(0x1f, 0x4e, 0x9c);
/// Simulation with the criterion `ndrc`.
const GREEN: RGBColor = RGBColor(0x2a, 0x7f, 0x3f);
/// Eq. 15.
const RED: RGBColor = RGBColor(0xc0, 0x39, 0x2b);
/// Marks and other lines.
const GREY: RGBColor = RGBColor(0x55, 0x55, 0x55);
/// Lines of a family, in order.
const FAMILY: [RGBColor; 6] =
    [BLUE, RED, GREEN, RGBColor(0x8e, 0x44, 0xad), RGBColor(0xb8, 0x72, 0x0a), RGBColor(0x16, 0x8a, 0x94)];

/// Why there is no figure.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FigureError {
    /// Nothing to draw: no finite point in range.
    #[error("there is nothing to draw: {0}")]
    Empty(&'static str),
    /// The drawing library gave up.
    #[error("the figure cannot be drawn: {0}")]
    Drawing(String),
}

fn drawing(error: impl Display) -> FigureError {
    FigureError::Drawing(error.to_string())
}

/// A point (x, y).
pub type Point = (f64, f64);

/// One line of a figure.
struct Line {
    name: String,
    color: RGBColor,
    dashed: bool,
    points: Vec<Point>,
}

impl Line {
    fn new(name: impl Into<String>, color: RGBColor, points: Vec<Point>) -> Self {
        let points = points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        Self { name: name.into(), color, dashed: false, points }
    }

    fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }
}

/// Marks of one kind.
struct Marks {
    name: String,
    color: RGBColor,
    points: Vec<Point>,
}

/// What stands on the axes of a figure.
struct Frame<'a> {
    title: &'a str,
    x: &'a str,
    y: &'a str,
    legend: SeriesLabelPosition,
}

/// Least and greatest of `values`, widened where they are one.
fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return None;
    }
    // A single value needs a width that its own size can resolve.
    let room = if low < high { 0.0 } else { 0.1 * low.abs().max(1e-12) };
    Some((low - room, high + room))
}

fn all_points<'a>(lines: &'a [Line], marks: &'a [Marks]) -> impl Iterator<Item = Point> + 'a {
    lines.iter().flat_map(|line| line.points.iter()).chain(marks.iter().flat_map(|m| m.points.iter())).copied()
}

/// Runs `draw` on an empty white SVG.
fn svg(
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), FigureError>,
) -> Result<String, FigureError> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(drawing)?;
        draw(&root)?;
        root.present().map_err(drawing)?;
    }
    Ok(text)
}

/// Draws lines and marks with their legend into a chart, whatever its axes.
macro_rules! draw_series {
    ($chart:expr, $lines:expr, $marks:expr) => {{
        for line in $lines {
            let color = line.color;
            let dashed = line.dashed;
            let style = color.stroke_width(2);
            // A path as such: the series of lines is a feature of the library that nothing else needs.
            let path = line.points.clone();
            let series = if dashed {
                $chart
                    .draw_series([plotters::element::DashedPathElement::new(path.into_iter(), 7, 5, style)])
                    .map_err(drawing)?
            } else {
                $chart.draw_series([PathElement::new(path, style)]).map_err(drawing)?
            };
            series.label(&line.name).legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + if dashed { 10 } else { 20 }, y)], color.stroke_width(2))
            });
        }
        for marks in $marks {
            let color = marks.color;
            $chart
                .draw_series(marks.points.iter().map(|point| Circle::new(*point, 3, color.mix(0.75).filled())))
                .map_err(drawing)?
                .label(&marks.name)
                .legend(move |(x, y)| Circle::new((x + 10, y), 3, color.filled()));
        }
    }};
}

/// A figure with linear axes.
fn linear(frame: &Frame<'_>, lines: &[Line], marks: &[Marks]) -> Result<String, FigureError> {
    let (x0, x1) = span(all_points(lines, marks).map(|p| p.0)).ok_or(FigureError::Empty("no finite point"))?;
    let (y0, y1) = span(all_points(lines, marks).map(|p| p.1)).ok_or(FigureError::Empty("no finite point"))?;
    let room = 0.05 * (y1 - y0);
    svg(|root| {
        let mut chart = ChartBuilder::on(root)
            .caption(frame.title, ("sans-serif", 19))
            .margin(14)
            .x_label_area_size(46)
            .y_label_area_size(72)
            .build_cartesian_2d(x0..x1, (y0 - room).min(y0)..y1 + room)
            .map_err(drawing)?;
        chart
            .configure_mesh()
            .x_desc(frame.x)
            .y_desc(frame.y)
            .light_line_style(WHITE)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 15))
            .x_label_formatter(&|v| number(*v))
            .y_label_formatter(&|v| number(*v))
            .draw()
            .map_err(drawing)?;
        draw_series!(chart, lines, marks);
        chart
            .configure_series_labels()
            .position(frame.legend.clone())
            .background_style(WHITE.mix(0.85))
            .border_style(GREY)
            .label_font(("sans-serif", 13))
            .draw()
            .map_err(drawing)
    })
}

/// A figure with logarithmic axes over the given ranges, both above zero.
fn logarithmic(
    frame: &Frame<'_>,
    x: (f64, f64),
    y: (f64, f64),
    lines: &[Line],
    marks: &[Marks],
) -> Result<String, FigureError> {
    svg(|root| {
        let mut chart = ChartBuilder::on(root)
            .caption(frame.title, ("sans-serif", 19))
            .margin(14)
            .x_label_area_size(46)
            .y_label_area_size(72)
            .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())
            .map_err(drawing)?;
        chart
            .configure_mesh()
            .x_desc(frame.x)
            .y_desc(frame.y)
            .light_line_style(WHITE)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 15))
            .x_label_formatter(&|v| number(*v))
            .y_label_formatter(&|v| number(*v))
            .draw()
            .map_err(drawing)?;
        draw_series!(chart, lines, marks);
        chart
            .configure_series_labels()
            .position(frame.legend.clone())
            .background_style(WHITE.mix(0.85))
            .border_style(GREY)
            .label_font(("sans-serif", 13))
            .draw()
            .map_err(drawing)
    })
}

/// A tick: six significant digits without trailing zeros, and no `-0`.
fn number(value: f64) -> String {
    // Through its decimal text, so that 0.1 + 0.2 is written 0.3.
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let rounded = if rounded.abs() < 1e-300 { 0.0 } else { rounded };
    if rounded != 0.0 && !(1e-4..1e7).contains(&rounded.abs()) { format!("{rounded:e}") } else { rounded.to_string() }
}

/// The paper's Figure 4: `E_c/(d³ fc)` over H/d of the simulation by both criteria, Eq. 15, and measured `points`.
///
/// # Errors
/// [`FigureError`].
pub fn critical_energy(rows: &[Row], points: &[Point]) -> Result<String, FigureError> {
    let along = |value: fn(&Row) -> Option<f64>| {
        rows.iter().filter_map(|row| Some((row.thickness_ratio?, value(row)?))).collect::<Vec<_>>()
    };
    let lines = [
        Line::new("simulation, full depth x = H", BLUE, along(|row| row.energy_full_depth)),
        Line::new("simulation, ndrc x = x_p(H)", GREEN, along(|row| row.energy_ndrc)),
        Line::new("Eq. 15, printed", RED, along(|row| row.eq15_printed)).dashed(),
    ];
    let marks =
        (!points.is_empty()).then(|| Marks { name: "measured".to_owned(), color: GREY, points: points.to_vec() });
    let frame = Frame {
        title: "Critical impact energy over target thickness",
        x: "H/d",
        y: "E_c/(d³ f_c)",
        legend: SeriesLabelPosition::UpperLeft,
    };
    linear(&frame, &lines, marks.as_slice())
}

/// The paper's Figure 5: simulation less Eq. 15 in percent of Eq. 15, over H/d, by both criteria.
///
/// Thinner slabs than H/d = 1 are left out: there the difference runs to thousands of percent and hides the rest.
///
/// # Errors
/// [`FigureError`].
pub fn critical_energy_difference(rows: &[Row]) -> Result<String, FigureError> {
    let over = |energy: fn(&Row) -> Option<f64>, eq15: fn(&Row) -> Option<f64>| {
        rows.iter()
            .filter(|row| row.thickness_ratio.is_some_and(|ratio| ratio >= 1.0))
            .filter_map(|row| Some((row.thickness_ratio?, 100.0 * (energy(row)? / eq15(row)? - 1.0))))
            .collect::<Vec<_>>()
    };
    let full = over(|row| row.energy_full_depth, |row| row.eq15_printed);
    let (first, last) = match (full.first(), full.last()) {
        (Some(first), Some(last)) => (first.0, last.0),
        _ => return Err(FigureError::Empty("no point has H/d >= 1")),
    };
    let lines = [
        Line::new("full depth over Eq. 15, printed", BLUE, full),
        Line::new("ndrc over Eq. 15, printed", RED, over(|row| row.energy_ndrc, |row| row.eq15_printed)),
        Line::new("ndrc over Eq. 15, unrounded", GREEN, over(|row| row.energy_ndrc, |row| row.eq15_unrounded)).dashed(),
        Line::new("limit of full depth for H/d and N infinite", GREY, vec![(first, 24.0), (last, 24.0)]).dashed(),
    ];
    let frame = Frame {
        title: "Simulation less Eq. 15, relative to Eq. 15",
        x: "H/d",
        y: "difference [%]",
        legend: SeriesLabelPosition::UpperRight,
    };
    linear(&frame, &lines, &[])
}

/// Critical velocity over the first axis of any sweep: one line, or up to six values of a second axis.
///
/// # Errors
/// [`FigureError`].
pub fn critical_velocity(plan: &Plan, rows: &[Row]) -> Result<String, FigureError> {
    let [first, rest @ ..] = plan.axes() else { return Err(FigureError::Empty("no axis")) };
    let inner = rest.first().map_or(1, |axis| axis.count);
    // Six lines at most, the ends of the second axis among them.
    let shown = inner.min(FAMILY.len());
    let lines: Vec<Line> = (0..shown)
        .map(|line| {
            let column = if shown == 1 { 0 } else { line * (inner - 1) / (shown - 1) };
            let points = (0..first.count)
                .filter_map(|i| {
                    let row = &rows[i * inner + column];
                    Some((row.values[0], row.critical_velocity?))
                })
                .collect();
            let name = rest
                .first()
                .map_or("V_c".to_owned(), |axis| format!("{} = {}", axis.parameter, number(axis.value(column))));
            Line::new(name, FAMILY[line], points)
        })
        .collect();
    let x = match first.parameter.dimension() {
        Some(dimension) => format!("{} [{}]", first.parameter, dimension.units()[0]),
        None => first.parameter.to_string(),
    };
    let frame = Frame { title: "Critical velocity", x: &x, y: "V_c [m/s]", legend: SeriesLabelPosition::LowerRight };
    linear(&frame, &lines, &[])
}

/// Scenes marked on the map: name of the set and its (I, N).
pub type MarkedSet<'a> = (&'a str, Vec<Point>);

/// The map of Eq. 11-12 over (I, N): lines of 1, 5 and 20 % error, and the scenes of measured sets.
///
/// # Errors
/// [`FigureError`].
pub fn applicability_map(crater_ratio: f64, sets: &[MarkedSet<'_>]) -> Result<String, FigureError> {
    // Room above for the names: the lines meet the upper edge at the right only.
    let (x, y) = ((0.01, 1000.0), (0.1, 100_000.0));
    let impacts: Vec<f64> = (0..=600).map(|i| 10f64.powf(-2.0 + f64::from(i) / 120.0)).collect();
    let colors = [GREEN, BLUE, RED];
    let mut lines = Vec::new();
    for (level, color) in LEVELS.iter().zip(colors) {
        for (index, stretch) in applicability::contour(*level, &impacts, crater_ratio).into_iter().enumerate() {
            let visible: Vec<_> = stretch.into_iter().filter(|p| (y.0..=y.1).contains(&p.1)).collect();
            let side = if index == 0 { "Eq. 11 too shallow by" } else { "Eq. 12 too deep by" };
            let line = Line::new(format!("{side} {} %", number(100.0 * level)), color, visible);
            lines.push(if index == 0 { line.dashed() } else { line });
        }
    }
    let marks: Vec<Marks> = sets
        .iter()
        .zip(FAMILY.iter().cycle())
        .map(|((name, points), color)| Marks { name: (*name).to_owned(), color: *color, points: points.clone() })
        .collect();
    let title = format!(
        "Error of Eq. 11-12 against the equation of motion: lines for k = {}, shots by their own k",
        number(crater_ratio)
    );
    let frame = Frame { title: &title, x: "I", y: "N", legend: SeriesLabelPosition::UpperLeft };
    logarithmic(&frame, x, y, &lines, &marks)
}

/// Predicted over measured depth [m] with the band of ±20 %; one kind of mark for each set.
///
/// # Errors
/// [`FigureError`]: no point with both depths above zero.
pub fn measured_depths(sets: &[MarkedSet<'_>]) -> Result<String, FigureError> {
    let marks: Vec<Marks> = sets
        .iter()
        .zip(FAMILY.iter().cycle())
        .map(|((name, points), color)| Marks {
            name: (*name).to_owned(),
            color: *color,
            points: points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0).collect(),
        })
        .collect();
    let depths = marks.iter().flat_map(|m| m.points.iter()).flat_map(|(x, y)| [*x, *y]);
    let (low, high) = span(depths).ok_or(FigureError::Empty("no point has both depths above zero"))?;
    let range = (0.8 * low.max(1e-12), 1.25 * high);
    let line = |name: &str, factor: f64, color| {
        Line::new(name, color, vec![(range.0, factor * range.0), (range.1, factor * range.1)])
    };
    let lines = [line("equal", 1.0, GREY), line("+20 %", 1.2, GREY).dashed(), line("-20 %", 0.8, GREY).dashed()];
    let frame = Frame {
        title: "Predicted and measured depth, S of Eq. 14, k = 0.707 + h/d",
        x: "measured depth [m]",
        y: "predicted depth [m]",
        legend: SeriesLabelPosition::UpperLeft,
    };
    logarithmic(&frame, range, (0.8 * range.0, 1.2 * range.1), &lines, &marks)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    fn row(ratio: f64, energy: f64) -> Row {
        Row {
            thickness_ratio: Some(ratio),
            energy_full_depth: Some(energy),
            energy_ndrc: Some(0.5 * energy),
            eq15_printed: Some(0.5 * energy),
            eq15_unrounded: Some(0.5 * energy),
            ..Row::default()
        }
    }

    #[test]
    fn same_data_give_the_same_figure() {
        let rows = [row(1.0, 2.0), row(2.0, 9.0), row(3.0, 20.0)];
        let figure = critical_energy(&rows, &[(2.0, 5.0)]).unwrap();
        assert_eq!(figure, critical_energy(&rows, &[(2.0, 5.0)]).unwrap());
        assert_ne!(figure, critical_energy(&rows, &[]).unwrap());
        assert!(figure.contains("E_c/(d³ f_c)") && figure.contains("#1F4E9C"));
    }

    #[test]
    fn nothing_finite_is_no_figure() {
        assert!(matches!(critical_energy(&[], &[]), Err(FigureError::Empty(_))));
        assert!(matches!(critical_energy(&[row(1.0, f64::NAN)], &[]), Err(FigureError::Empty(_))));
        assert!(matches!(critical_energy_difference(&[row(0.5, 1.0)]), Err(FigureError::Empty(_))));
        assert!(matches!(measured_depths(&[("set", vec![(0.0, 1.0)])]), Err(FigureError::Empty(_))));
    }

    #[test]
    fn a_single_point_has_a_figure() {
        let figure = critical_energy(&[row(5.0, 40.0)], &[]).unwrap();
        assert!(figure.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!(number(0.1 + 0.2), "0.3");
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(2e7), "2e7");
        assert_eq!(number(12.5), "12.5");
    }
}
