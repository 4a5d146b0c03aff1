//! The figures of stability and rounding, for the reports of the suite and of the stress cases.

use super::chart::{Axis, HEIGHT, Ink, Key, KeyPlace, Mark, Panel, Shape};
use super::figure::{Figure, Part};
use super::table::{Table, or_empty};
use super::text::number;
use crate::integrators::VelocityAt;
use crate::studies::rounding::{Errors, Floor};
use crate::studies::stability::BoundaryPoint;

/// Where amplitudes begin to grow: measured points on the lines of theory, over the drag group.
///
/// `None` without a point.
pub fn boundary(points: &[BoundaryPoint]) -> Option<Figure> {
    let mut table = Table::new(["velocity_rule", "drag_group", "w_dt_measured", "w_dt_theory"]);
    for p in points {
        table.push([&p.velocity, &p.drag_group, &p.measured, &p.theory]);
    }
    let off = points.iter().map(|p| (p.measured / p.theory - 1.0).abs()).reduce(f64::max)?;
    let rules = [VelocityAt::LaggedHalfStep, VelocityAt::Centred, VelocityAt::PredictedHalfStep];
    let (mut marks, mut keys) = (Vec::new(), Vec::new());
    for (index, rule) in rules.into_iter().enumerate() {
        let of_rule = || points.iter().filter(|p| p.velocity == rule);
        let (ink, shape) = (Ink::series(index), Shape::series(index));
        let theory = of_rule().map(|p| (p.drag_group, p.theory)).collect();
        let measured = of_rule().map(|p| (p.drag_group, p.measured)).collect();
        marks.push(Mark::Line { points: theory, ink, dashed: true });
        marks.push(Mark::Points { points: measured, ink, shape, hollow: false, radius: 3.0 });
        keys.push(Key::points(rule.to_string(), ink, shape));
    }
    Some(Figure {
        name: "stability-map".into(),
        part: Part::Stability,
        message: format!(
            "The measured boundary of stability lies on the theoretical one within {} %",
            number(100.0 * off, 2)
        ),
        reading: "Below its line a velocity rule is stable, above it amplitudes grow. Points: where growth sets in over \
                  4000 steps, by bisection; dashed: the spectral radius of one step. With a lagged drag the stable step \
                  shrinks as the drag grows; centred drag leaves it at 2."
            .to_owned(),
        claims: Vec::new(),
        panels: vec![Panel {
            title: "onset of growth, w dt over Q V dt/M".into(),
            description: format!(
                "w dt at which growth sets in over the drag group, for three velocity rules, measured and in theory; at \
                 most {} % apart.",
                number(100.0 * off, 2)
            ),
            x: Axis::linear("Q V dt/M", points.iter().map(|p| p.drag_group).chain([0.0])),
            y: Axis::linear("w dt", points.iter().flat_map(|p| [p.measured, p.theory]).chain([0.0])),
            marks,
            keys,
            key_place: KeyPlace::TopLeft,
            height: HEIGHT + 50,
        }],
        table,
    })
}

/// A series of the rounding figure: name, colour, shape, whether hollow, and its errors.
type Series = (&'static str, Ink, Shape, bool, fn(&Floor) -> Errors);

const SERIES: [Series; 4] = [
    ("f32", Ink::Orange, Shape::Triangle, false, |row| row.single),
    ("f32, compensated", Ink::Orange, Shape::Triangle, true, |row| row.single_compensated),
    ("f64", Ink::Blue, Shape::Circle, false, |row| row.plain),
    ("f64, compensated", Ink::Blue, Shape::Circle, true, |row| row.compensated),
];

/// Error of the depth against dt down to the floor of each number type, and the rounding in it alone.
///
/// `None` without a row.
pub fn rounding(rows: &[Floor]) -> Option<Figure> {
    let last = rows.iter().rfind(|row| row.truncation.is_some())?;
    let mut table = Table::new(["dt_s", "steps", "numbers", "sums", "total_error", "rounding_error"]);
    for row in rows {
        table.push([&row.dt, &row.steps, &"double-double", &"plain", &or_empty(row.truncation), &""]);
        for (numbers, sums, errors) in [
            ("f64", "plain", row.plain),
            ("f64", "compensated", row.compensated),
            ("f32", "plain", row.single),
            ("f32", "compensated", row.single_compensated),
        ] {
            table.push([&row.dt, &row.steps, &numbers, &sums, &errors.total, &or_empty(errors.rounding)]);
        }
    }
    let least = |pick: fn(&Floor) -> Errors| rows.iter().map(|row| pick(row).total).fold(f64::INFINITY, f64::min);
    let gain = last.plain.rounding? / last.compensated.rounding?;
    let x = Axis::log("step [s]", rows.iter().map(|row| row.dt));
    let errors = |row: &Floor| -> Vec<f64> {
        let of = |errors: Errors| [Some(errors.total), errors.rounding];
        SERIES.iter().flat_map(|(.., pick)| of(pick(row))).chain([row.truncation]).flatten().collect()
    };
    let mut y = Axis::log("relative error of the depth", rows.iter().flat_map(errors));
    // Single errors that happen to vanish are drawn at the lower edge; above there is room for the legend.
    y.range = [y.range[0].max(1e-18), y.range[1] * 1e4];
    let panel = |title: &str, description: String, pick: fn(Errors) -> Option<f64>, truncation: bool| {
        let mut marks = Vec::new();
        let mut keys = Vec::new();
        if truncation {
            let points = rows.iter().filter_map(|row| Some((row.dt, row.truncation?))).collect();
            marks.push(Mark::Line { points, ink: Ink::Muted, dashed: false });
            keys.push(Key::line("double-double: truncation", Ink::Muted, false));
        }
        for (name, ink, shape, hollow, of) in SERIES {
            let points = rows.iter().filter_map(|row| Some((row.dt, pick(of(row))?))).collect();
            marks.push(Mark::Points { points, ink, shape, hollow, radius: 3.0 });
            keys.push(Key { text: name.to_owned(), ink, shape: Some(shape), hollow });
        }
        Panel {
            title: title.to_owned(),
            description,
            x: x.clone(),
            y: y.clone(),
            marks,
            keys,
            key_place: if truncation { KeyPlace::Corner } else { KeyPlace::TopRight },
            height: HEIGHT + 70,
        }
    };
    Some(Figure {
        name: "rounding-floor".into(),
        part: Part::Stability,
        message: format!(
            "Rounding sets the floor: {} in f32, {} in f64; after {} steps compensated sums leave {} times less of it",
            number(least(|row| row.single), 1),
            number(least(|row| row.plain), 1),
            last.steps,
            number(gain, 2),
        ),
        reading:
            "Left: error against the exact depth as the step falls from right to left; it follows the truncation, \
                  of second order, until rounding outweighs it. Right: the rounding alone, against the same steps in \
                  double-double. Hollow: compensated sums."
                .to_owned(),
        claims: Vec::new(),
        panels: vec![
            panel(
                "error of the depth",
                format!(
                    "Errors fall with dt² to a floor of {} in f32 and {} in f64.",
                    number(least(|row| row.single), 1),
                    number(least(|row| row.plain), 1)
                ),
                |errors| Some(errors.total),
                true,
            ),
            panel(
                "of it rounding",
                format!(
                    "Rounding grows with the number of steps; compensated sums leave {} times less.",
                    number(gain, 2)
                ),
                |errors| errors.rounding,
                false,
            ),
        ],
        table,
    })
}
