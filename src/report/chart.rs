//! A diagram: axes and series in; ranges, ticks, legend, places of names, and a description out.
//!
//! A panel is written as SVG elements that name their colours by class, so that a page or a file sets them for light,
//! dark and print. The same colours stand beside the classes for programs without style sheets. Series differ by shape
//! or dashes as well as by colour. Lengths are pixels of a panel [`WIDTH`] wide: on paper, two in a row, its text has 8 pt.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use super::text::{number, power_of_ten};
use super::typeset;
use crate::exchange::tables::{Value, push_line};

/// Width of a panel: it fits a phone of 375 px.
pub const WIDTH: f64 = 344.0;
/// Height of a diagram without title, legend and axis labels.
pub const HEIGHT: f64 = 188.0;

const LEFT: f64 = 46.0;
const RIGHT: f64 = 10.0;
const TITLE: f64 = 22.0;
/// Height of a line of text.
const LINE: f64 = 16.0;
const BOTTOM: f64 = 38.0;
const SYMBOL: f64 = 22.0;
/// Width of lines from which they let others be seen through them.
const WIDE_FROM: f64 = 3.0;
/// Height from which a panel without a scale at its left has an axis above it too.
const HIGH: f64 = 400.0;

/// A point in the units of the axes.
pub type Point = (f64, f64);

/// A colour by its role.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ink {
    /// What everything stands on.
    Paper,
    /// Text.
    Text,
    /// Axes, second text, reference lines.
    Muted,
    /// Grid.
    Grid,
    /// Shaded regions.
    Shade,
    /// First series; what passed.
    Blue,
    /// Second series; what is undecided.
    Orange,
    /// Third series.
    Teal,
    /// Fourth series.
    Purple,
    /// What failed.
    Red,
}

impl Ink {
    /// Name, light and dark value in the order of the variants. Contrast: text at least 4.5 : 1, lines 3 : 1.
    const ALL: [[&'static str; 3]; 10] = [
        ["paper", "#ffffff", "#161a20"],
        ["text", "#1c222a", "#e6eaef"],
        ["muted", "#5a6470", "#a3adb8"],
        ["grid", "#dfe3e8", "#333a44"],
        ["shade", "#e6e9ee", "#29303a"],
        ["blue", "#1b5fb4", "#6fb1ff"],
        ["orange", "#b05005", "#f2a15b"],
        ["teal", "#0b7466", "#4fcfba"],
        ["purple", "#7d3ca6", "#cba2f2"],
        ["red", "#b41e2b", "#ff8f8f"],
    ];

    fn name(self) -> &'static str {
        Self::ALL[self as usize][0]
    }

    fn light(self) -> &'static str {
        Self::ALL[self as usize][1]
    }

    /// The style sheet of every drawing: variables by the names of the colours, and classes `f-…` to fill with them and
    /// `s-…` for lines. Text inside an element of class `plot` has an outline in the colour of the paper.
    pub fn style_sheet() -> String {
        let [mut light, mut dark, mut classes] = [const { String::new() }; 3];
        for [name, value, value_in_dark] in Self::ALL {
            let _ = write!(light, "--{name}:{value};");
            let _ = write!(dark, "--{name}:{value_in_dark};");
            let _ = write!(classes, ".f-{name}{{fill:var(--{name})}}.s-{name}{{stroke:var(--{name})}}");
        }
        format!(
            ":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}{classes}\
             .plot text{{paint-order:stroke;stroke:var(--paper);stroke-width:3px;stroke-linejoin:round}}"
        )
    }
}

/// Corners of marks in units of the radius: circle, triangle, square, diamond, and triangle point down.
const SHAPES: [&[Point]; 5] = [
    &[],
    &[(0.0, -1.3), (1.25, 0.9), (-1.25, 0.9)],
    &[(-0.95, -0.95), (0.95, -0.95), (0.95, 0.95), (-0.95, 0.95)],
    &[(0.0, -1.4), (1.4, 0.0), (0.0, 1.4), (-1.4, 0.0)],
    &[(0.0, 1.3), (1.25, -0.9), (-1.25, -0.9)],
];

/// Dashes of lines: solid, long, dotted, dash and dot.
const DASHES: [&str; 4] = ["none", "6 3", "2 2", "8 3 2 3"];

/// How a series is drawn: as a line, as marks, as both, or as an area.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Style {
    ink: Ink,
    is_area: bool,
    dash: Option<&'static str>,
    shape: Option<&'static [Point]>,
    is_hollow: bool,
    radius: f64,
    width: f64,
}

impl Style {
    /// An area within the points.
    pub const fn area(ink: Ink) -> Self {
        Self { ink, is_area: true, dash: None, shape: None, is_hollow: false, radius: 2.75, width: 1.75 }
    }

    /// A dashed line for what was not measured.
    pub const REFERENCE: Self = Self { is_area: false, dash: Some("4 3"), width: 1.25, ..Self::area(Ink::Muted) };

    /// A line; each of the first four indices has a colour and dashes of its own.
    pub fn line(index: usize) -> Self {
        let ink = [Ink::Blue, Ink::Orange, Ink::Teal, Ink::Purple][index % 4];
        Self { is_area: false, dash: Some(DASHES[(index + index / 4) % 4]), ..Self::area(ink) }
    }

    /// Marks; each of the first twenty indices has its own pair of colour and shape.
    pub fn marks(index: usize) -> Self {
        Self { dash: None, shape: Some(SHAPES[index % 5]), ..Self::line(index) }
    }

    /// Marks on a solid line.
    pub fn marked_line(index: usize) -> Self {
        Self { dash: Some(DASHES[0]), ..Self::marks(index) }
    }

    /// A solid line of the same colour, without marks.
    pub fn as_line(self) -> Self {
        Self { dash: Some(DASHES[0]), shape: None, ..self }
    }

    /// A solid line so wide and pale that another one on it is seen, and leaves its edges to be seen.
    pub fn wide(self) -> Self {
        Self { dash: Some(DASHES[0]), width: 5.0, ..self }
    }

    /// In this colour.
    pub fn ink(self, ink: Ink) -> Self {
        Self { ink, ..self }
    }

    /// Only the outline of the marks.
    pub fn hollow(self) -> Self {
        Self { is_hollow: true, ..self }
    }

    /// One of three, with marks smaller than those of the one before, so that one shows around another where they coincide.
    pub fn nested(index: usize) -> Self {
        Self::marks(index).radius([4.8, 3.0, 1.8][index % 3])
    }

    /// With marks of this radius.
    pub fn radius(self, radius: f64) -> Self {
        Self { radius, ..self }
    }
}

/// An axis: linear or logarithmic. Its range follows from the series unless it is set.
#[derive(Clone, Debug, Default, PartialEq)]
#[must_use]
pub struct Axis {
    label: String,
    is_log: bool,
    included: Vec<f64>,
    range: Option<[f64; 2]>,
    least: f64,
}

impl Axis {
    /// A linear axis; `unit` is empty for a number without one.
    pub fn linear(title: &str, unit: &str) -> Self {
        let label = if unit.is_empty() { title.to_owned() } else { format!("{title} [{unit}]") };
        Self { label, ..Self::default() }
    }

    /// A logarithmic axis. Values that are not positive are not drawn.
    pub fn log(title: &str, unit: &str) -> Self {
        Self { is_log: true, ..Self::linear(title, unit) }
    }

    /// Draws what is below `least` there, zero included. For a logarithmic axis.
    pub fn from(self, least: f64) -> Self {
        Self { least, ..self }
    }

    /// Extends the range to `values`.
    pub fn including(mut self, values: impl IntoIterator<Item = f64>) -> Self {
        self.included.extend(values);
        self
    }

    /// Sets the range; what lies beyond is drawn at the edge.
    pub fn over(self, range: [f64; 2]) -> Self {
        Self { range: Some(range), ..self }
    }

    /// Its label, with the power of ten that its numbers leave to it.
    fn label(&self, span: Span) -> String {
        match (span.power(), self.label.rsplit_once(" [")) {
            (0, _) => self.label.clone(),
            (power, None) => format!("{} [{}]", self.label, power_of_ten(power)),
            (power, Some((title, unit))) => format!("{title} [{} {unit}", power_of_ten(power)),
        }
    }

    fn has(&self, value: f64) -> bool {
        value.is_finite() && (value.max(self.least) > 0.0 || !self.is_log)
    }

    /// Where `value` is drawn.
    fn drawn(&self, value: f64) -> f64 {
        if self.is_log { value.max(self.least) } else { value }
    }

    /// The axis over `values`, with a margin, and `headroom` as a share of its length above them.
    fn fitted(&self, values: impl Iterator<Item = f64>, headroom: f64) -> Span {
        let all = values.chain(self.included.iter().copied()).filter(|v| self.has(*v)).map(|v| self.drawn(v));
        let [low, high] = match (self.range, extremes(all)) {
            (Some(range), _) => range,
            (None, None) => [0.1, 1.0],
            (None, Some([low, high])) if self.is_log => {
                // The wider of a factor and a fortieth of the decades: no mark lies on the edge.
                let pad = (high.powf(0.025) / low.powf(0.025)).max(1.5);
                [low / pad, high * pad]
            }
            (None, Some([low, high])) => {
                let pad = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
                [if low >= 0.0 && low < 0.2 * high { 0.0 } else { low - pad }, high + pad]
            }
        };
        let mut span = Span { is_log: self.is_log, low: 0.0, high: 1.0 };
        (span.low, span.high) = (span.place(low), span.place(high));
        span.high += headroom * span.length();
        span
    }
}

/// The least and the greatest of `values`.
pub fn extremes(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values.into_iter().map(|value| [value; 2]).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}

/// An axis with its range, in values or their decimal logarithms.
#[derive(Clone, Copy, Debug)]
struct Span {
    is_log: bool,
    low: f64,
    high: f64,
}

impl Span {
    fn place(&self, value: f64) -> f64 {
        if self.is_log { value.max(f64::MIN_POSITIVE).log10() } else { value }
    }

    fn value(&self, place: f64) -> f64 {
        if self.is_log { 10.0_f64.powf(place) } else { place }
    }

    fn length(&self) -> f64 {
        self.high - self.low
    }

    /// `value` as a share of the axis: 0 to 1 on it.
    fn share(&self, value: f64) -> f64 {
        (self.place(value) - self.low) / self.length()
    }

    /// The power of ten that the numbers of a linear axis leave to its label: zero where they need none.
    fn power(&self) -> i32 {
        let power = self.low.abs().max(self.high.abs()).log10().floor();
        if self.is_log || !power.is_finite() || (-2.0..5.0).contains(&power) { 0 } else { power as i32 }
    }

    /// Grid lines, `most` at most where the axis is longer than two decades: share of the axis and label.
    fn ticks(&self, most: f64) -> Vec<(f64, String)> {
        let length = self.length();
        let places: Vec<f64> = if self.is_log && length < 2.0 {
            let mantissas: &[f64] = if length < 0.5 { &[1., 2., 3., 4., 5., 6., 7., 8., 9.] } else { &[1., 2., 5.] };
            let decades = self.low.floor() as i32..=self.high.floor() as i32;
            decades.flat_map(|decade| mantissas.iter().map(move |m| m.log10() + f64::from(decade))).collect()
        } else {
            let decade = if self.is_log { 1.0 } else { 10.0_f64.powf((length / most).log10().floor()) };
            let steps = if self.is_log { [1., 2., 3., 5., 10., 20., 50.] } else { [1., 2., 2.5, 5., 10., 20., 50.] };
            let step = steps.map(|s| s * decade).into_iter().find(|s| length / s <= most).unwrap_or(length);
            let first = (self.low / step).ceil();
            (0..=most.ceil() as u32 + 1).map(|i| (first + f64::from(i)) * step).collect()
        };
        let is_inside = |place: &f64| *place >= self.low - 1e-9 * length && *place <= self.high + 1e-9 * length;
        let places: Vec<f64> = places.into_iter().filter(is_inside).collect();
        // All labels of an axis have one form: `5·10⁻⁴` stands above no `0.001`.
        let has_powers = length >= 2.0 || places.iter().any(|place| !(-3.0..5.0).contains(&(place + 1e-9)));
        let scale = 10.0_f64.powi(self.power());
        let label = |place: f64| match self.is_log {
            true if has_powers => {
                let decade = (place + 1e-9).floor();
                let power = power_of_ten(decade as i32);
                match 10.0_f64.powf(place - decade).round() as u32 {
                    1 => power,
                    mantissa => format!("{mantissa}·{power}"),
                }
            }
            true => number(self.value(place), 2),
            false => number(if place.abs() < 1e-9 * length { 0.0 } else { place / scale }, 3),
        };
        places.iter().map(|place| ((place - self.low) / length, label(*place))).collect()
    }
}

/// Where a text stands against its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum Anchor {
    /// To the right of it.
    Start,
    /// To the left of it.
    End,
    /// Across it.
    Middle,
}

#[derive(Clone, Debug, PartialEq)]
struct Series {
    name: String,
    is_listed: bool,
    style: Style,
    points: Vec<Point>,
}

/// A line of known slope.
#[derive(Clone, Debug, PartialEq)]
struct Reference {
    name: String,
    slope: f64,
    through: Point,
}

/// One diagram of a figure.
#[derive(Clone, Debug, Default, PartialEq)]
#[must_use]
pub struct Panel {
    /// What sets it apart from its neighbours.
    pub title: String,
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    references: Vec<Reference>,
    uprights: Vec<(String, f64)>,
    labels: Vec<(Point, String, Anchor)>,
    names: Vec<(Point, String)>,
    height: f64,
}

impl Panel {
    /// A panel without data. A `y` without a title is not drawn.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, height: HEIGHT, ..Self::default() }
    }

    /// Sets the height of the diagram.
    pub fn tall(self, height: f64) -> Self {
        Self { height, ..self }
    }

    /// Adds a series. It stands in the legend, series of the same name once.
    pub fn series(mut self, name: impl Into<String>, style: Style, points: impl IntoIterator<Item = Point>) -> Self {
        self.series.push(Series { name: name.into(), is_listed: true, style, points: points.into_iter().collect() });
        self
    }

    /// Adds a series that is not in the legend; its name is in the table.
    pub fn unlisted(self, name: impl Into<String>, style: Style, points: impl IntoIterator<Item = Point>) -> Self {
        let mut panel = self.series(name, style, points);
        panel.series.iter_mut().rev().take(1).for_each(|series| series.is_listed = false);
        panel
    }

    /// Adds a dashed line of this slope, in decades where an axis is logarithmic. Its name stands beside it, where it hides
    /// the fewest points.
    pub fn slope(mut self, name: impl Into<String>, slope: f64, through: Point) -> Self {
        self.references.push(Reference { name: name.into(), slope, through });
        self
    }

    /// Adds a dashed upright line at `x`, with its name at the top.
    pub fn upright(mut self, name: impl Into<String>, x: f64) -> Self {
        self.uprights.push((name.into(), x));
        self
    }

    /// Adds a text.
    pub fn label(mut self, at: Point, text: impl Into<String>, anchor: Anchor) -> Self {
        self.labels.push((at, text.into(), anchor));
        self
    }

    /// Adds the name of a point. It stands on the side of it where it hides the fewest others.
    pub fn name(mut self, of: Point, text: impl Into<String>) -> Self {
        self.names.push((of, text.into()));
        self
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.points().next().is_none()
    }

    /// Gives all `panels` the same ranges.
    pub fn share_axes(panels: &mut [Self]) {
        let points: Vec<Point> = panels.iter().flat_map(Self::points).collect();
        for panel in panels {
            panel.x.included.extend(points.iter().map(|p| p.0));
            panel.y.included.extend(points.iter().map(|p| p.1));
        }
    }

    /// What is drawn and determines the ranges.
    fn points(&self) -> impl Iterator<Item = Point> {
        self.series.iter().flat_map(|series| self.drawn(series))
    }

    /// The points of `series` that have a place on the axes.
    fn drawn(&self, series: &Series) -> impl Iterator<Item = Point> {
        let has_place = |(x, y): &&Point| self.x.has(*x) && self.y.has(*y);
        series.points.iter().filter(has_place).map(|(x, y)| (self.x.drawn(*x), self.y.drawn(*y)))
    }

    /// Appends a line of CSV for each point of each series.
    pub(super) fn push_lines(&self, csv: &mut String) {
        for Series { name, points, .. } in &self.series {
            for (x, y) in points {
                let [title, name, x_axis, y_axis] =
                    [&self.title, name, &self.x.label, &self.y.label].map(|t| Value::Text(t));
                push_line(csv, &[title, name, x_axis, Value::Number(Some(*x)), y_axis, Value::Number(Some(*y))]);
            }
        }
    }

    /// Whether its axis stands above it too: a reader of a high panel does not see both ends.
    fn has_two_axes(&self) -> bool {
        self.y.label.is_empty() && self.height > HIGH
    }

    /// Rows in which the names of upright lines stand.
    fn upright_rows(&self) -> usize {
        if self.uprights.len() > 2 { 3 } else { self.uprights.len().min(1) }
    }

    /// Entries of the legend in rows.
    pub(super) fn legend_rows(&self) -> usize {
        self.legend().last().map_or(0, |(_, row, _)| row + 1)
    }

    /// Entries of the legend: left edge, row, and series.
    fn legend(&self) -> Vec<(f64, usize, &Series)> {
        let mut entries: Vec<(f64, usize, &Series)> = Vec::new();
        let (mut x, mut row) = (2.0, 0);
        let is_shown =
            |series: &&Series| series.is_listed && !series.name.is_empty() && self.drawn(series).next().is_some();
        for series in self.series.iter().filter(is_shown) {
            if entries.iter().any(|(.., known)| known.name == series.name) {
                continue;
            }
            let width = SYMBOL + width_of(&series.name);
            if x > 2.0 && x + width > WIDTH {
                (x, row) = (2.0, row + 1);
            }
            entries.push((x, row, series));
            x += width + 10.0;
        }
        entries
    }

    fn frame(&self, legend_rows: usize) -> Frame {
        let left = if self.y.label.is_empty() { RIGHT } else { LEFT };
        let label = if self.y.label.is_empty() && !self.has_two_axes() { 0.5 } else { 1.5 };
        Frame {
            x: self.x.fitted(self.points().map(|p| p.0), 0.0),
            y: self.y.fitted(self.points().map(|p| p.1), 0.08 * self.upright_rows() as f64),
            left,
            top: TITLE + LINE * (legend_rows as f64 + label),
            width: WIDTH - left - RIGHT,
            height: self.height,
        }
    }

    /// Height of the panel with its title, a legend of so many rows, and its axes.
    pub(super) fn full_height(&self, legend_rows: usize) -> f64 {
        self.frame(legend_rows).top + self.height + BOTTOM
    }

    /// What is seen, in words.
    pub fn description(&self) -> String {
        let frame = self.frame(0);
        let ends = |axis: &Axis, span: Span| {
            let [low, high] = [span.low, span.high].map(|place| number(span.value(place), 2));
            let scale = if axis.is_log { ", logarithmic" } else { "" };
            format!("{} from {low} to {high}{scale}", axis.label)
        };
        let x = ends(&self.x, frame.x);
        let axes = if self.y.label.is_empty() { x } else { format!("{} over {x}", ends(&self.y, frame.y)) };
        let names: Vec<_> = self.legend().into_iter().map(|(.., series)| series.name.as_str()).collect();
        let names = if names.is_empty() { String::new() } else { format!(" Series: {}.", names.join("; ")) };
        format!("{axes}.{names}")
    }

    /// What `series` covers (px): its points, and places on its line between them.
    fn covered(&self, series: &Series, frame: &Frame) -> Vec<Point> {
        let points: Vec<Point> = self.drawn(series).map(|point| frame.at(point)).collect();
        let is_line = series.style.dash.is_some() && !series.style.is_area;
        let lines = points.windows(2).filter(|_| is_line).flat_map(|ends| {
            let ends = [ends[0], ends[1]];
            (1..20).map(move |part| along(ends, f64::from(part) / 20.0))
        });
        points.iter().copied().chain(lines).collect()
    }

    /// The names of the reference lines and their places: each beside its line, clear of other lines and of what is drawn
    /// where that can be.
    fn reference_names(&self, frame: &Frame) -> Vec<(&str, Point, Anchor)> {
        let lines: Vec<(&Reference, [Point; 2])> = self
            .references
            .iter()
            .filter_map(|line| Some((line, line.ends(frame)?.map(|end| frame.inside(end)))))
            .collect();
        let drawn: Vec<Point> = self.series.iter().flat_map(|series| self.covered(series, frame)).collect();
        let (mut taken, mut names): (Vec<[f64; 4]>, _) = (Vec::new(), Vec::new());
        for (line, ends) in &lines {
            let width = width_of(&line.name);
            let rises = ends[1].1 < ends[0].1;
            // Above a line that rises the name ends at it, below it begins there; it never lies across its own line.
            let is_level = ends[0].1 == ends[1].1;
            let candidates = [(-5.0, rises), (13.0, !rises)].into_iter().flat_map(|(shift, is_before)| {
                (0..=40).map(move |part| {
                    let (x, y) = along(*ends, f64::from(part) / 40.0);
                    let left = if is_before && !is_level { x - 4.0 - width } else { x + 4.0 };
                    (left, y + shift)
                })
            });
            let hidden = |(left, base): &Point| {
                let [right, top, bottom] = [left + width, base - 10.0, base + 3.0];
                // A mark reaches beyond its point.
                let holds =
                    |(x, y): &Point| (*left - 4.0..=right + 4.0).contains(x) && (top - 4.0..=bottom + 4.0).contains(y);
                let others = lines.iter().filter(|(other, _)| *other != *line);
                let crossed = others.flat_map(|(_, ends)| (0..=100).map(|part| along(*ends, f64::from(part) / 100.0)));
                let is_taken = taken.iter().any(|[l, r, t, b]| *left < *r && right > *l && top < *b && bottom > *t);
                drawn.iter().filter(|p| holds(p)).count()
                    + crossed.filter(|p| holds(p)).count()
                    + 1000 * usize::from(is_taken)
            };
            let is_inside = |(left, base): &Point| {
                *left >= frame.left
                    && left + width <= frame.left + frame.width
                    && *base >= frame.top + 10.0
                    && *base <= frame.top + frame.height - 3.0
            };
            if let Some(place) = candidates.filter(is_inside).min_by_key(hidden) {
                taken.push([place.0, place.0 + width, place.1 - 10.0, place.1 + 3.0]);
                names.push((line.name.as_str(), place, Anchor::Start));
            }
        }
        names
    }

    /// Where the name of a point begins.
    fn place_of_name(&self, frame: &Frame, of: Point, name: &str) -> Point {
        let ((x, y), width) = (frame.at(of), width_of(name));
        let sides =
            [(x + 5.0, y + 4.0), (x - 5.0 - width, y + 4.0), (x - 0.5 * width, y - 6.0), (x - 0.5 * width, y + 15.0)];
        let hidden = |(left, base): &Point| {
            let holds = |(x, y): Point| x > left - 4.0 && x < left + width + 4.0 && y > base - 13.0 && y < base + 6.0;
            let is_outside = *left < frame.left || left + width > frame.left + frame.width;
            self.points().filter(|point| holds(frame.at(*point))).count() + 1000 * usize::from(is_outside)
        };
        sides.into_iter().min_by_key(hidden).unwrap_or((x, y))
    }

    /// The panel as SVG elements, the legend in `legend_rows` rows.
    pub(super) fn draw(&self, legend_rows: usize) -> Markup {
        let frame = self.frame(legend_rows);
        // Shades stand behind the grid.
        let (shades, others): (Vec<_>, Vec<_>) = self.series.iter().partition(|s| s.style.ink == Ink::Shade);
        let draw =
            |series: &Series| symbol(&series.style, &self.drawn(series).map(|p| frame.at(p)).collect::<Vec<_>>());
        html! {
            g.plot font-size="11" {
                @for series in shades { (draw(series)) }
                (self.grid(&frame))
                @for (_, x) in &self.uprights {
                    (symbol(&Style::REFERENCE, &[0.0, 1.0].map(|v| frame.inside((frame.x.share(*x), v)))))
                }
                @for line in &self.references {
                    @if let Some(ends) = line.ends(&frame) { (symbol(&Style::REFERENCE, &ends.map(|p| frame.inside(p)))) }
                }
                @for series in others { (draw(series)) }
                @for (index, (name, x)) in self.uprights.iter().enumerate() {
                    (frame.upright_name(name, *x, index % self.upright_rows()))
                }
                @for (name, place, anchor) in self.reference_names(&frame) { (text(place, name, Ink::Muted, anchor)) }
                @for (at, label, anchor) in &self.labels {
                    @let (x, y) = frame.at(*at);
                    (text((x, y + 4.0), label, Ink::Text, *anchor))
                }
                @for (of, name) in &self.names { (text(self.place_of_name(&frame, *of, name), name, Ink::Text, Anchor::Start)) }
                @for (x, row, series) in self.legend() {
                    @let y = TITLE + LINE * (row as f64 + 0.5);
                    @let key = [(x, y), (x + 8.0, y), (x + 16.0, y)];
                    @if series.style.is_area {
                        (symbol(&series.style, &[(x, y - 4.0), (x + 16.0, y - 4.0), (x + 16.0, y + 4.0), (x, y + 4.0)]))
                    } @else {
                        (symbol(&Style { shape: None, ..series.style }, &key))
                        (symbol(&Style { dash: None, ..series.style }, &key[1..2]))
                    }
                    (text((x + SYMBOL, y + 4.0), &series.name, Ink::Text, Anchor::Start))
                }
                g font-size="13" font-weight="bold" { (text((2.0, 14.0), &fitting(&self.title), Ink::Text, Anchor::Start)) }
                @if !self.y.label.is_empty() {
                    (text((2.0, frame.top - 10.0), &self.y.label(frame.y), Ink::Muted, Anchor::Start))
                }
                (text((WIDTH - RIGHT, frame.top + self.height + 32.0), &self.x.label(frame.x), Ink::Muted, Anchor::End))
            }
        }
    }

    /// Grid, numbers, and the lower edge.
    fn grid(&self, frame: &Frame) -> Markup {
        let columns = frame.x.ticks(6.0);
        let rows = if self.y.label.is_empty() { Vec::new() } else { frame.y.ticks(7.0) };
        let across = |v: f64| polyline(&[0.0, 1.0].map(|u| frame.inside((u, v))));
        let along = |u: f64| polyline(&[0.0, 1.0].map(|v| frame.inside((u, v))));
        let lines = columns.iter().map(|(u, _)| along(*u)).chain(rows.iter().map(|(v, _)| across(*v)));
        html! {
            (path(&lines.collect::<String>(), Ink::Grid, false, "none", 1.0))
            (path(&across(0.0), Ink::Muted, false, "none", 1.0))
            @for (u, label) in &columns {
                @let (x, y) = frame.inside((*u, 0.0));
                (text((x, y + 15.0), label, Ink::Muted, Anchor::Middle))
                @if self.has_two_axes() { (text((x, frame.top - 5.0), label, Ink::Muted, Anchor::Middle)) }
            }
            @if self.has_two_axes() { (path(&across(1.0), Ink::Muted, false, "none", 1.0)) }
            @for (v, label) in &rows {
                @let (x, y) = frame.inside((0.0, *v));
                (text((x - 6.0, y + 4.0), label, Ink::Muted, Anchor::End))
            }
        }
    }
}

impl Reference {
    /// Where the line enters and leaves the panel, in shares of it.
    fn ends(&self, frame: &Frame) -> Option<[Point; 2]> {
        let (a, b) = (frame.x.share(self.through.0), frame.y.share(self.through.1));
        let slope = self.slope * frame.x.length() / frame.y.length();
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        if slope == 0.0 {
            high = if (0.0..=1.0).contains(&b) { high } else { low };
        } else {
            let [bottom, top] = [0.0, 1.0].map(|v| a + (v - b) / slope);
            (low, high) = (low.max(bottom.min(top)), high.min(bottom.max(top)));
        }
        (low < high).then(|| [low, high].map(|u| (u, b + slope * (u - a))))
    }
}

/// The diagram within its panel.
struct Frame {
    x: Span,
    y: Span,
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Frame {
    /// Shares of the axes in pixels.
    fn inside(&self, (u, v): Point) -> Point {
        (self.left + u * self.width, self.top + (1.0 - v) * self.height)
    }

    /// A point in pixels; what lies beyond an axis stands at its end.
    fn at(&self, (x, y): Point) -> Point {
        self.inside((self.x.share(x).clamp(0.0, 1.0), self.y.share(y).clamp(0.0, 1.0)))
    }

    /// The name of an upright line, on the side where there is more room.
    fn upright_name(&self, name: &str, x: f64, row: usize) -> Markup {
        let (x, y) = self.inside((self.x.share(x), 1.0));
        let is_right = x > self.left + 0.5 * self.width;
        let (beside, anchor) = if is_right { (x - 5.0, Anchor::End) } else { (x + 5.0, Anchor::Start) };
        text((beside, y + 11.0 + 12.0 * row as f64), name, Ink::Muted, anchor)
    }
}

/// A place between the ends of a line, by its share of the way.
fn along([from, to]: [Point; 2], share: f64) -> Point {
    (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1))
}

/// Width of `text` in a wide sans-serif font.
fn width_of(text: &str) -> f64 {
    let width = |c| match c {
        'f' | 'i' | 'j' | 'l' | 't' | ' ' | '.' | ',' | ':' | ';' | '-' | '(' | ')' | '|' => 4.0,
        'm' | 'w' | 'M' | 'W' | '%' => 10.0,
        c if c.is_uppercase() || c.is_ascii_digit() => 7.3,
        _ => 6.5,
    };
    text.chars().map(width).sum()
}

/// A title as wide as a panel at most. What is too much is left out of the middle of the name before the last comma: names
/// differ at either end, and a number stays whole.
fn fitting(title: &str) -> String {
    // Widths in a bold font of 13 px.
    let width = |c: &char| match c {
        'f' | 'i' | 'j' | 'l' | 't' | ' ' | '\u{a0}' | '.' | ',' | ':' | ';' | '-' | '(' | ')' | '|' => 5.0,
        'm' | 'w' | 'M' | 'W' | '%' => 13.0,
        'r' | 's' | 'c' => 7.6,
        c if c.is_uppercase() || c.is_ascii_digit() => 9.1,
        '⁰'..='⁾' | '¹' | '²' | '³' => 6.0,
        _ => 8.9,
    };
    let chars: Vec<char> = title.chars().collect();
    let wide = |chars: &[char]| chars.iter().map(width).sum::<f64>();
    if wide(&chars) <= WIDTH {
        return title.to_owned();
    }
    let end = title.rfind(", ").map_or(chars.len(), |at| title[..at].chars().count());
    let (mut left, mut right) = (end / 2, end / 2);
    while wide(&chars[..left]) + width(&'…') + wide(&chars[right..]) > WIDTH && right < chars.len() {
        if left > 1 && (right >= end || left >= end - right) {
            left -= 1;
        } else {
            right += 1;
        }
    }
    chars[..left].iter().chain(&['…']).chain(&chars[right..]).collect()
}

fn text((x, y): Point, text: &str, ink: Ink, anchor: Anchor) -> Markup {
    let [x, y] = [x, y].map(|length| format!("{length:.1}"));
    html! {
        text x=(x) y=(y) text-anchor=(<&str>::from(anchor)) fill=(ink.light()) class={ "f-" (ink.name()) } { (typeset::svg(text)) }
        (PreEscaped("\n"))
    }
}

/// `points` (px) drawn as `style` has it.
fn symbol(style: &Style, points: &[Point]) -> Markup {
    let marks = |shape| points.iter().map(|point| mark(shape, *point, style.radius)).collect::<String>();
    html! {
        @if points.is_empty() {
        } @else if style.is_area {
            (path(&format!("{}Z", polyline(points)), style.ink, true, "none", 0.0))
        } @else {
            @if let Some(dash) = style.dash { (path(&polyline(points), style.ink, false, dash, style.width)) }
            @if let Some(shape) = style.shape { (path(&marks(shape), style.ink, !style.is_hollow, "none", 1.4)) }
        }
    }
}

fn path(data: &str, ink: Ink, is_filled: bool, dash: &str, width: f64) -> Markup {
    html! {
        @if is_filled {
            path d=(data) fill=(ink.light()) class={ "f-" (ink.name()) } {}
        } @else {
            path d=(data) fill="none" stroke=(ink.light()) class={ "s-" (ink.name()) } stroke-width=(width)
                stroke-dasharray=(dash) stroke-linejoin="round" stroke-opacity=[(width > WIDE_FROM).then_some("0.4")] {}
        }
        (PreEscaped("\n"))
    }
}

fn polyline(points: &[Point]) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let _ = write!(data, "{}{x:.2} {y:.2}", if index == 0 { 'M' } else { 'L' });
    }
    data
}

fn mark(shape: &[Point], (x, y): Point, radius: f64) -> String {
    if shape.is_empty() {
        let (left, across) = (x - radius, 2.0 * radius);
        return format!("M{left:.2} {y:.2}a{radius} {radius} 0 1 0 {across} 0a{radius} {radius} 0 1 0 -{across} 0Z");
    }
    let corners: Vec<_> = shape.iter().map(|(u, v)| (x + u * radius, y + v * radius)).collect();
    polyline(&corners) + "Z"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, values: [f64; 2]) -> Vec<String> {
        axis.fitted(values.into_iter(), 0.0).ticks(6.0).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_decades_where_there_are_many_and_round_numbers_elsewhere() {
        let log = Axis::log("error", "");
        assert_eq!(labels(&log, [1e-9, 1e-6]), ["10⁻⁹", "10⁻⁸", "10⁻⁷", "10⁻⁶"]);
        assert_eq!(labels(&log, [1e-15, 1e-2]), ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³"]);
        assert_eq!(labels(&log, [2.0, 40.0]), ["2", "5", "10", "20", "50"]);
        assert_eq!(labels(&log, [6e-4, 9e-3]), ["5·10⁻⁴", "10⁻³", "2·10⁻³", "5·10⁻³", "10⁻²"]);
        assert_eq!(labels(&Axis::linear("depth", "mm"), [0.0, 100.0]), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(
            labels(&Axis::linear("depth", "mm").over([-0.1, 0.1]), [0.0; 2]),
            ["−0.1", "−0.05", "0", "0.05", "0.1"]
        );
    }

    #[test]
    fn shared_axes_hold_the_points_of_every_panel_and_nothing_else() {
        let panel = |point| {
            let (x, y) = (Axis::linear("velocity", "m/s"), Axis::linear("depth", "m"));
            Panel::new("a panel", x, y).series("a series", Style::nested(0), [point])
        };
        let mut panels = [panel((800.0, 1.0)), panel((300.0, 2.0))];
        Panel::share_axes(&mut panels);
        for panel in &panels {
            assert_eq!((&panel.x.included[..], &panel.y.included[..]), (&[800.0, 300.0][..], &[1.0, 2.0][..]));
        }
    }

    #[test]
    fn numbers_beyond_five_digits_leave_their_power_to_the_label() {
        let strength = Axis::linear("strength", "Pa");
        assert_eq!(labels(&strength, [2e7, 6e7]), ["2", "3", "4", "5", "6"]);
        assert_eq!(strength.label(strength.fitted([2e7, 6e7].into_iter(), 0.0)), "strength [10⁷ Pa]");
        let ratio = Axis::linear("ratio", "");
        assert_eq!(labels(&ratio, [0.0, 0.002]), ["0", "0.5", "1", "1.5", "2"]);
        assert_eq!(ratio.label(ratio.fitted([0.0, 0.002].into_iter(), 0.0)), "ratio [10⁻³]");
        assert_eq!(ratio.label(ratio.fitted([0.0, 20_000.0].into_iter(), 0.0)), "ratio");
    }

    #[test]
    fn a_title_that_is_too_wide_loses_its_middle() {
        let own = "crater end time, less 3.749918414287\u{a0}×\u{a0}10⁻⁴ s";
        assert_eq!(fitting(own), own);
        let cut = fitting("peak_deceleration_of_the_projectile_centre_of_mass_m_s2, less 1.234568 × 10⁵");
        assert!(cut.starts_with("peak_decel…") && cut.ends_with("less 1.234568 × 10⁵"), "{cut}");
        assert!(cut.chars().count() < 50, "{cut}");
    }

    #[test]
    fn a_series_without_a_point_is_not_in_the_legend() {
        let panel = Panel::new("", Axis::log("x", ""), Axis::log("y", ""))
            .series("drawn", Style::marks(0), [(1.0, 1.0)])
            .series("not drawn", Style::marks(1), [(1.0, 0.0)])
            .series("empty", Style::marks(2), []);
        assert_eq!(panel.legend().into_iter().map(|(.., series)| series.name.as_str()).collect::<Vec<_>>(), ["drawn"]);
    }

    #[test]
    fn without_data_or_with_a_single_point_there_are_ticks() {
        for axis in [Axis::linear("x", ""), Axis::log("x", "")] {
            assert!(!labels(&axis, [f64::NAN; 2]).is_empty());
            assert!(!labels(&axis, [3.0; 2]).is_empty());
        }
    }

    /// Whatever the range, a line of known slope begins and ends on the edge of the diagram and has its slope.
    #[test]
    fn a_reference_line_ends_at_the_edges() {
        let panel =
            Panel::new("", Axis::log("step", "s").over([1e-8, 1e-5]), Axis::log("error", "").over([1e-12, 1e-3]));
        let frame = panel.slope("slope 2", 2.0, (1e-6, 1e-8)).frame(0);
        let line = |slope| Reference { name: String::new(), slope, through: (1e-6, 1e-8) };
        for slope in [-2.0, -1.0, 0.0, 1.0, 2.0, 30.0] {
            let [from, to] = line(slope).ends(&frame).unwrap_or_default();
            for (u, v) in [from, to] {
                assert!([u, 1.0 - u, v, 1.0 - v].iter().any(|edge| edge.abs() < 1e-12), "slope {slope}: {u}, {v}");
            }
            let decades = 9.0 * (to.1 - from.1) / (3.0 * (to.0 - from.0));
            assert!((decades - slope).abs() < 1e-12 * slope.abs().max(1.0), "slope {slope}: {decades}");
        }
        let outside = Reference { through: (1e-6, 1.0), ..line(0.0) };
        assert_eq!(outside.ends(&frame), None);
    }

    #[test]
    fn names_of_reference_lines_hide_nothing_where_there_is_room() {
        let steps = (0..=200).map(|i| 10f64.powf(-8.0 + 3.0 * f64::from(i) / 200.0));
        let axes = [Axis::log("step", "s"), Axis::log("error", "").over([1e-14, 1e-3])];
        let [x, y] = axes;
        let panel = Panel::new("", x, y)
            .slope("slope 1", 1.0, (1e-5, 1e-4))
            .slope("slope 2", 2.0, (1e-5, 1e-4))
            .series("second order", Style::marks(0), steps.map(|h| (h, 1e5 * h * h)));
        let frame = panel.frame(1);
        let names = panel.reference_names(&frame);
        assert_eq!(names.iter().map(|(name, ..)| *name).collect::<Vec<_>>(), ["slope 1", "slope 2"]);
        let inside = |(x, y): Point, (left, base): Point| {
            x > left && x < left + width_of("slope 1") && y < base && y > base - 10.0
        };
        for (_, place, _) in &names {
            assert!(panel.points().all(|point| !inside(frame.at(point), *place)), "{names:?}");
        }
        let [first, second] = [names[0].1, names[1].1];
        assert!((first.0 - second.0).abs() > 40.0 || (first.1 - second.1).abs() > 12.0, "{names:?}");
    }

    /// A fitted law is drawn through two points alone.
    #[test]
    fn names_of_reference_lines_stand_clear_of_lines_between_points() {
        let law = [(5e-7, 9.2e-4), (4e-6, 7.4e-3)];
        let panel = Panel::new("", Axis::log("step", "s"), Axis::log("error", ""))
            .slope("order 1", 1.0, (4e-6, 0.045))
            .slope("order 2", 2.0, (4e-6, 0.045))
            .series("fit", Style::line(1).as_line(), law);
        let frame = panel.frame(1);
        let ends = law.map(|point| frame.at(point));
        let names = panel.reference_names(&frame);
        assert_eq!(names.len(), 2);
        for (name, (left, base), _) in names {
            let is_hidden = |(x, y): Point| x > left && x < left + width_of(name) && y > base - 10.0 && y < base + 3.0;
            assert!((0..=100).all(|part| !is_hidden(along(ends, f64::from(part) / 100.0))), "{name}");
        }
    }

    #[test]
    fn nothing_is_drawn_outside_its_diagram_and_no_name_stands_twice() {
        let y = Axis::linear("y", "m").over([0.0, 1.0]);
        let panel = Panel::new("t", Axis::linear("x", "s"), y)
            .series("name", Style::marked_line(0), [(0.0, -5.0), (1.0, 7.0), (f64::NAN, 0.5)])
            .series("name", Style::marks(0), [(0.5, 0.5)]);
        let frame = panel.frame(1);
        assert_eq!(frame.at((0.0, -5.0)), frame.at((0.0, 0.0)));
        assert_eq!((panel.legend_rows(), panel.points().count()), (1, 3));
        let drawing = panel.draw(1).into_string();
        assert_eq!(drawing.matches(">name<").count(), 1);
        assert!(!drawing.contains("NaN") && !drawing.contains("inf"), "{drawing}");
        assert_eq!(panel.description(), "y [m] from 0 to 1 over x [s] from 0 to 1.1. Series: name.");
    }

    #[test]
    fn twenty_series_differ_without_their_colour() {
        for index in 0..20 {
            let same_colour = (0..index).filter(|other| Style::marks(*other).ink == Style::marks(index).ink);
            for other in same_colour {
                assert_ne!(Style::marks(other), Style::marks(index));
            }
        }
        let dashes: Vec<_> = (0..4).map(|index| Style::line(index).dash).collect();
        assert!((0..4).all(|i| (0..i).all(|j| dashes[i] != dashes[j])));
    }
}
