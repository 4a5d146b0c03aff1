//! How a figure is drawn: panels of one size, drawn by plotters, in colours that follow the page.
//!
//! plotters places everything on whole units, so a panel is drawn [`FINE`] times larger than it is shown and scaled by
//! its view box. Colours stand in the drawing as plain ones, for programs that know no style sheets, and once more as
//! classes ([`Ink`]) that the page sets for light, dark and print.

use std::fmt::Write as _;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

use super::text::{number, one_line, power_of_ten};

/// Units of the drawing per unit shown.
const FINE: i32 = 4;
/// Width of a panel [px at full size]; it fits a phone of 375 px.
pub const WIDTH: i32 = 344;
/// Radius of a point, unless it says otherwise [px].
pub const RADIUS: f64 = 2.75;
/// Height of a panel, unless it says otherwise [px].
pub const HEIGHT: i32 = 270;

const LEFT: i32 = 44;
const RIGHT: i32 = 10;
const TOP: i32 = 44;
const BOTTOM: i32 = 38;
/// What a panel is higher than its diagram [px].
pub const MARGINS: i32 = TOP + BOTTOM;
/// Widths of lines [units of the drawing]. They tell dashed lines from the others, which plotters' drawing does not.
const SOLID: u32 = 7;
const DASHED: u32 = 5;
const OUTLINE: u32 = 6;
const TEXT: f64 = 11.0;
const TITLE: f64 = 13.0;

/// A colour by its role.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ink {
    /// Text and axes.
    Text,
    /// Second text, reference lines.
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
    /// Every colour with its class, its light and its dark value. Text is readable at 4.5 : 1, lines at 3 : 1.
    pub const ALL: [(Self, &'static str, [u8; 3], [u8; 3]); 9] = [
        (Self::Text, "text", [0x1c, 0x22, 0x2a], [0xe6, 0xea, 0xef]),
        (Self::Muted, "muted", [0x5a, 0x64, 0x70], [0xa3, 0xad, 0xb8]),
        (Self::Grid, "grid", [0xdf, 0xe3, 0xe8], [0x33, 0x3a, 0x44]),
        (Self::Shade, "shade", [0xec, 0xee, 0xf2], [0x29, 0x2f, 0x38]),
        (Self::Blue, "blue", [0x1b, 0x5f, 0xb4], [0x6f, 0xb1, 0xff]),
        (Self::Orange, "orange", [0xb0, 0x50, 0x05], [0xf2, 0xa1, 0x5b]),
        (Self::Teal, "teal", [0x0b, 0x74, 0x66], [0x4f, 0xcf, 0xba]),
        (Self::Purple, "purple", [0x7d, 0x3c, 0xa6], [0xcb, 0xa2, 0xf2]),
        (Self::Red, "red", [0xb4, 0x1e, 0x2b], [0xff, 0x8f, 0x8f]),
    ];

    /// The colour of series `index`.
    pub fn series(index: usize) -> Self {
        [Self::Blue, Self::Orange, Self::Teal, Self::Purple][index % 4]
    }

    fn rgb(self) -> RGBColor {
        let [r, g, b] = Self::ALL.iter().find(|(ink, ..)| *ink == self).map_or([0; 3], |(_, _, light, _)| *light);
        RGBColor(r, g, b)
    }

    /// The style sheet of a drawing, `selector` before every rule: classes `s-…` for lines, `f-…` for areas and text.
    pub fn style_sheet() -> String {
        let mut css = String::from(":root{");
        let mut dark = String::new();
        let mut rules = String::new();
        for (_, name, [r, g, b], [dr, dg, db]) in Self::ALL {
            let _ = write!(css, "--{name}:#{r:02x}{g:02x}{b:02x};");
            let _ = write!(dark, "--{name}:#{dr:02x}{dg:02x}{db:02x};");
            let _ = write!(rules, ".f-{name}{{fill:var(--{name})}}.s-{name}{{stroke:var(--{name})}}");
        }
        format!("{css}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}{rules}")
    }
}

/// How a point looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Round.
    Circle,
    /// Square.
    Square,
    /// Triangle, point up.
    Triangle,
}

impl Shape {
    /// The shape of series `index`.
    pub fn series(index: usize) -> Self {
        [Self::Circle, Self::Triangle, Self::Square][index % 3]
    }
}

/// Whether an axis counts equal distances or equal ratios.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal distances.
    Linear,
    /// Equal ratios.
    Log,
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Its scale.
    pub scale: Scale,
    /// Its ends, ascending; both positive on a logarithmic one.
    pub range: [f64; 2],
    /// Whether values stand beside it.
    pub numbered: bool,
}

impl Axis {
    /// A linear axis over `values`, with a margin.
    pub fn linear(label: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = ends(values).unwrap_or((0.0, 1.0));
        let pad = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        let low = if low >= 0.0 && low < 0.2 * high { 0.0 } else { low - pad };
        Self { label: label.into(), scale: Scale::Linear, range: [low, high + pad], numbered: true }
    }

    /// A logarithmic axis over the positive ones of `values`, with a margin.
    pub fn log(label: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = ends(values.into_iter().filter(|v| *v > 0.0)).unwrap_or((0.1, 1.0));
        Self { label: label.into(), scale: Scale::Log, range: [low / 1.5, high * 1.5], numbered: true }
    }

    /// Place on the axis: the value, or its decimal logarithm.
    pub fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.max(f64::MIN_POSITIVE).log10(),
        }
    }

    /// `value` as a share of the axis, 0 to 1 on it.
    pub fn share(&self, value: f64) -> f64 {
        let [low, high] = self.places();
        (self.place(value) - low) / (high - low)
    }

    fn places(&self) -> [f64; 2] {
        self.range.map(|end| self.place(end))
    }

    /// Whether `value` lies on the axis.
    pub fn holds(&self, value: f64) -> bool {
        self.range[0] <= value && value <= self.range[1]
    }

    /// Places of the grid lines, `most` at most.
    fn ticks(&self, most: f64) -> Vec<f64> {
        let [low, high] = self.places();
        let span = high - low;
        let step = match self.scale {
            Scale::Log => {
                [1.0, 2.0, 3.0, 4.0, 5.0, 10.0, 20.0, 50.0].into_iter().find(|s| span / s <= most).unwrap_or(100.0)
            }
            Scale::Linear => {
                let decade = 10.0_f64.powf((span / most).log10().floor());
                [1.0, 2.0, 2.5, 5.0, 10.0].map(|s| s * decade).into_iter().find(|s| span / s <= most).unwrap_or(span)
            }
        };
        let first = (low / step).ceil() as i64;
        (0..=most.ceil() as i64 + 1)
            .map(|i| (first + i) as f64 * step)
            .take_while(|place| *place <= high + 1e-9 * span)
            .collect()
    }

    fn tick_label(&self, place: f64) -> String {
        match self.scale {
            Scale::Log => power_of_ten(place.round() as i32),
            Scale::Linear => number(if place.abs() < 1e-12 * self.range[1].abs() { 0.0 } else { place }, 3),
        }
    }
}

fn ends(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|v| v.is_finite()).fold(None, |ends, v| match ends {
        None => Some((v, v)),
        Some((low, high)) => Some((v.min(low), v.max(high))),
    })
}

/// Where a text stands against its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// To the right of it.
    Start,
    /// To the left of it.
    End,
    /// Over it.
    Middle,
}

/// Something in a panel, in its coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A line through points.
    Line {
        /// The points.
        points: Vec<(f64, f64)>,
        /// Colour.
        ink: Ink,
        /// Whether it is broken into dashes.
        dashed: bool,
    },
    /// Points.
    Points {
        /// The points.
        points: Vec<(f64, f64)>,
        /// Colour.
        ink: Ink,
        /// Shape.
        shape: Shape,
        /// Whether only the outline is drawn.
        hollow: bool,
        /// Radius [px].
        radius: f64,
    },
    /// A shaded polygon, behind the grid.
    Area {
        /// Its corners.
        points: Vec<(f64, f64)>,
        /// Colour.
        ink: Ink,
    },
    /// A text.
    Text {
        /// Its place.
        at: (f64, f64),
        /// The text.
        text: String,
        /// Colour.
        ink: Ink,
        /// On which side of the place.
        anchor: Anchor,
    },
}

/// Where the legend of a panel stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyPlace {
    /// In the lower right corner, one below the other.
    Corner,
    /// In the upper left corner.
    TopLeft,
    /// In the upper right corner.
    TopRight,
    /// Above the diagram, side by side.
    Head,
}

/// An entry of the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Text.
    pub text: String,
    /// Colour.
    pub ink: Ink,
    /// Shape; `None` for a line.
    pub shape: Option<Shape>,
    /// Whether only the outline is drawn; of a line, whether it is dashed.
    pub hollow: bool,
}

impl Key {
    /// The entry of points.
    pub fn points(text: impl Into<String>, ink: Ink, shape: Shape) -> Self {
        Self { text: text.into(), ink, shape: Some(shape), hollow: false }
    }

    /// The entry of a line.
    pub fn line(text: impl Into<String>, ink: Ink, dashed: bool) -> Self {
        Self { text: text.into(), ink, shape: None, hollow: dashed }
    }
}

/// One diagram of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What sets it apart from its neighbours.
    pub title: String,
    /// What is seen in it, for those who cannot see it.
    pub description: String,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// What is in it, back to front.
    pub marks: Vec<Mark>,
    /// Legend.
    pub keys: Vec<Key>,
    /// Where the legend stands.
    pub key_place: KeyPlace,
    /// Height [px at full size].
    pub height: i32,
}

/// plotters could not draw.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("cannot draw `{panel}`: {cause}")]
pub struct DrawError {
    /// Title of the panel.
    pub panel: String,
    /// What plotters said.
    pub cause: String,
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Area<'b> = DrawingArea<SVGBackend<'b>, plotters::coord::Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

impl Panel {
    /// The elements of the drawing, to stand inside an `svg` of view box [`Panel::view_box`].
    ///
    /// # Errors
    /// [`DrawError`], if plotters refuses the coordinates.
    pub fn draw(&self) -> Result<String, DrawError> {
        let mut drawing = String::new();
        self.draw_on(&mut drawing)
            .map_err(|cause| DrawError { panel: self.title.clone(), cause: cause.to_string() })?;
        Ok(with_classes(&drawing))
    }

    /// View box of the drawing.
    pub fn view_box(&self) -> String {
        format!("0 0 {} {}", WIDTH * FINE, self.height * FINE)
    }

    fn draw_on(&self, drawing: &mut String) -> Drawn {
        let size = ((WIDTH * FINE).unsigned_abs(), (self.height * FINE).unsigned_abs());
        let root = SVGBackend::with_string(drawing, size).into_drawing_area();
        let [x0, x1] = self.x.places();
        let [y0, y1] = self.y.places();
        let left = if self.y.numbered { LEFT } else { RIGHT };
        let x_ticks = self.x.ticks(6.0);
        let y_ticks = if self.y.numbered { self.y.ticks(7.0) } else { Vec::new() };
        let mut chart = ChartBuilder::on(&root)
            .margin_top(TOP * FINE)
            .margin_right(RIGHT * FINE)
            .margin_left(left * FINE)
            .margin_bottom(BOTTOM * FINE)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        for mark in &self.marks {
            if let Mark::Area { points, ink } = mark {
                let corners: Vec<_> = points.iter().map(|p| self.place(*p)).collect();
                chart.draw_series([Polygon::new(corners, ink.rgb())])?;
            }
        }
        let grid = Ink::Grid.rgb().stroke_width(FINE.unsigned_abs());
        let lines = |at: &[f64], upright: bool| -> Vec<_> {
            at.iter()
                .map(|&t| PathElement::new(if upright { [(t, y0), (t, y1)] } else { [(x0, t), (x1, t)] }, grid))
                .collect()
        };
        chart.draw_series(lines(&x_ticks, true))?;
        chart.draw_series(lines(&y_ticks, false))?;
        let height = self.height;
        let pixel = |chart: &Chart<'_, '_>, at: (f64, f64)| chart.backend_coord(&at);
        for &tick in &x_ticks {
            let (x, _) = pixel(&chart, (tick, y0));
            let y = (height - BOTTOM + 5) * FINE;
            write_text(&root, (x, y), &self.x.tick_label(tick), TEXT, Ink::Muted, (HPos::Center, VPos::Top))?;
        }
        for &tick in &y_ticks {
            let (_, y) = pixel(&chart, (x0, tick));
            let at = ((LEFT - 6) * FINE, y);
            write_text(&root, at, &self.y.tick_label(tick), TEXT, Ink::Muted, (HPos::Right, VPos::Center))?;
        }
        let axis = Ink::Muted.rgb().stroke_width(FINE.unsigned_abs());
        chart.draw_series([PathElement::new(vec![(x0, y0), (x1, y0)], axis)])?;
        // Texts last: nothing is drawn over them.
        let (texts, others): (Vec<_>, Vec<_>) = self.marks.iter().partition(|mark| matches!(mark, Mark::Text { .. }));
        for mark in others.into_iter().chain(texts) {
            self.draw_mark(&mut chart, &root, mark)?;
        }
        self.draw_keys(&root)?;
        let start = (HPos::Left, VPos::Top);
        write_text(&root, (2 * FINE, 2 * FINE), &self.title, TITLE, Ink::Text, start)?;
        write_text(&root, (2 * FINE, 22 * FINE), &self.y.label, TEXT, Ink::Muted, start)?;
        let end = ((WIDTH - RIGHT) * FINE, (height - 15) * FINE);
        write_text(&root, end, &self.x.label, TEXT, Ink::Muted, (HPos::Right, VPos::Top))?;
        root.present()
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let [low, high] = self.y.places();
        // Nothing leaves the panel at its sides; above and below it is cut off.
        (self.x.place(x), self.y.place(y).clamp(low, high))
    }

    fn draw_mark(&self, chart: &mut Chart<'_, '_>, root: &Area<'_>, mark: &Mark) -> Drawn {
        match mark {
            Mark::Area { .. } => {}
            Mark::Line { points, ink, dashed } => {
                let style = ink.rgb().stroke_width(if *dashed { DASHED } else { SOLID });
                let path: Vec<_> = points.iter().map(|p| self.place(*p)).collect();
                chart.draw_series([PathElement::new(path, style)])?;
            }
            Mark::Points { points, ink, shape, hollow, radius } => {
                for point in points {
                    let at = chart.backend_coord(&self.place(*point));
                    draw_point(root, at, *ink, *shape, *hollow, *radius)?;
                }
            }
            Mark::Text { at, text, ink, anchor } => {
                let at = chart.backend_coord(&self.place(*at));
                let horizontal = match anchor {
                    Anchor::Start => HPos::Left,
                    Anchor::End => HPos::Right,
                    Anchor::Middle => HPos::Center,
                };
                write_text(root, at, text, TEXT, *ink, (horizontal, VPos::Center))?;
            }
        }
        Ok(())
    }

    fn draw_keys(&self, root: &Area<'_>) -> Drawn {
        const LINE: i32 = 16;
        let left = if self.y.numbered { LEFT } else { RIGHT };
        let mut right = WIDTH - RIGHT - if self.key_place == KeyPlace::Head { 4 } else { 8 };
        for (index, key) in self.keys.iter().enumerate().rev() {
            let from_top = TOP + 12 + LINE * whole(index);
            let y = match self.key_place {
                KeyPlace::Corner => self.height - BOTTOM - 12 - LINE * whole(self.keys.len() - 1 - index),
                KeyPlace::TopLeft | KeyPlace::TopRight => from_top,
                KeyPlace::Head => 28,
            } * FINE;
            // The symbol stands at the edge, the text beside it.
            let (symbol, text, side) = match self.key_place {
                KeyPlace::TopLeft => (left + 12, left + 24, HPos::Left),
                _ => (right, right - 12, HPos::Right),
            };
            write_text(root, (text * FINE, y), &key.text, TEXT, Ink::Text, (side, VPos::Center))?;
            match key.shape {
                Some(shape) => draw_point(root, (symbol * FINE, y), key.ink, shape, key.hollow, RADIUS)?,
                None => root.draw(&PathElement::new(
                    vec![((symbol - 8) * FINE, y), ((symbol + 4) * FINE, y)],
                    key.ink.rgb().stroke_width(if key.hollow { DASHED } else { SOLID }),
                ))?,
            }
            if self.key_place == KeyPlace::Head {
                // Letters of this size are six units wide on average.
                right -= 30 + 6 * whole(key.text.chars().count());
            }
        }
        Ok(())
    }
}

/// A count as a number of pixels.
fn whole(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

fn draw_point(root: &Area<'_>, (x, y): (i32, i32), ink: Ink, shape: Shape, hollow: bool, radius: f64) -> Drawn {
    let r = (radius * f64::from(FINE)).round() as i32;
    let outline = ink.rgb().stroke_width(OUTLINE);
    let corners = match shape {
        Shape::Circle if hollow => return root.draw(&Circle::new((x, y), r, outline)),
        Shape::Circle => return root.draw(&Circle::new((x, y), r, ink.rgb().filled())),
        Shape::Square => vec![(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r)],
        Shape::Triangle => vec![(x, y - r - 3), (x + r + 2, y + r - 2), (x - r - 2, y + r - 2)],
    };
    if hollow {
        let closed: Vec<_> = corners.iter().chain(corners.first()).copied().collect();
        root.draw(&PathElement::new(closed, outline))
    } else {
        root.draw(&Polygon::new(corners, ink.rgb()))
    }
}

fn write_text(
    root: &Area<'_>,
    at: (i32, i32),
    text: &str,
    size: f64,
    ink: Ink,
    (horizontal, vertical): (HPos, VPos),
) -> Drawn {
    // plotters divides the size of a font by this before it writes it.
    let size = size * f64::from(FINE) * 1.24;
    let weight = if size > TEXT * f64::from(FINE) * 1.24 { FontStyle::Bold } else { FontStyle::Normal };
    let colour = ink.rgb();
    let style = TextStyle::from(FontDesc::new(FontFamily::SansSerif, size, weight))
        .color(&colour)
        .pos(Pos::new(horizontal, vertical));
    root.draw(&Text::new(one_line(text), at, style))
}

/// The elements inside plotters' `svg`, colours named by class as well, without what says nothing.
fn with_classes(drawing: &str) -> String {
    let inner = drawing.split_once(">\n").map_or("", |(_, rest)| rest);
    let mut inner = inner.trim_end().trim_end_matches("</svg>").to_owned();
    for (from, to) in [
        (" opacity=\"1\"", ""),
        (" stroke=\"none\"", ""),
        (" stroke-width=\"1\"", ""),
        (" font-family=\"sans-serif\"", ""),
        ("\n</text>", "</text>"),
        (" \"/>", "\"/>"),
    ] {
        inner = inner.replace(from, to);
    }
    let width = format!(" stroke-width=\"{DASHED}\"");
    inner = inner.replace(&width, &format!("{width} stroke-dasharray=\"{} {}\"", 4 * FINE, 3 * FINE));
    for (_, name, [r, g, b], _) in Ink::ALL {
        let hex = format!("#{r:02X}{g:02X}{b:02X}");
        for (attribute, class) in [("fill", "f"), ("stroke", "s")] {
            inner = inner
                .replace(&format!("{attribute}=\"{hex}\""), &format!("{attribute}=\"{hex}\" class=\"{class}-{name}\""));
        }
    }
    inner
}
