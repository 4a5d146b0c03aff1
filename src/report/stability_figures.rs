//! The figures of stability and rounding, for the reports of the suite and of the stress cases.

use super::chart::{Axis, Ink, Panel, Style};
use super::figure::Figure;
use super::text::number;
use crate::studies::rounding::{Errors, Floor};
use crate::studies::stability::BoundaryPoint;
use crate::suite::{Judged, grouped};

/// Where amplitudes begin to grow: measured points on the lines of theory, over the drag group.
///
/// `None` without a point.
pub fn boundary(points: &[BoundaryPoint], judged: &[&Judged]) -> Option<Figure> {
    let off = points.iter().map(|p| (p.measured / p.theory - 1.0).abs()).reduce(f64::max)?;
    let off = number(100.0 * off, 2);
    let origin = |title| Axis::linear(title, "").including([0.0]);
    let mut panel = Panel::new("onset of growth, ω Δt over Q V Δt/M", origin("Q V Δt/M"), origin("ω Δt"));
    for (index, (rule, members)) in grouped(points, |p| p.velocity).into_iter().enumerate() {
        let style = Style::marks(index);
        panel = panel
            .unlisted(format!("{rule}, theory"), style.as_line(), members.iter().map(|p| (p.drag_group, p.theory)))
            .series(rule.to_string(), style, members.iter().map(|p| (p.drag_group, p.measured)));
    }
    Figure::new("stability-map", "", judged, &[&off], vec![panel])
}

/// The series of the rounding figure: numbers, sums, style, and their errors.
type Series = (&'static str, &'static str, Style, fn(&Floor) -> Errors);

/// Error of the depth against Δt down to the floor of each number type, and the rounding in it alone.
///
/// `None` without a row.
pub fn rounding(rows: &[Floor], judged: &[&Judged]) -> Option<Figure> {
    let series: [Series; 4] = [
        ("f64", "plain", Style::marks(0), |row| row.plain),
        ("f64", "compensated", Style::marks(0).hollow(), |row| row.compensated),
        ("f32", "plain", Style::marks(1), |row| row.single),
        ("f32", "compensated", Style::marks(1).hollow(), |row| row.single_compensated),
    ];
    let last = rows.iter().rfind(|row| row.truncation.is_some())?;
    let least =
        |pick: fn(&Floor) -> Errors| number(rows.iter().map(|row| pick(row).total).fold(f64::INFINITY, f64::min), 1);
    let floors = format!("{} in f32, {} in f64", least(|row| row.single), least(|row| row.plain));
    let gain = number(last.plain.rounding? / last.compensated.rounding?, 2);
    // Single errors that happen to vanish are not drawn.
    let panel = |title, pick: fn(Errors) -> Option<f64>| {
        let panel = Panel::new(title, Axis::log("step", "s"), Axis::log("relative error of the depth", ""));
        series.iter().fold(panel, |panel, (numbers, sums, style, errors)| {
            let points = rows.iter().filter_map(|row| Some((row.dt, pick(errors(row))?)));
            panel.series(format!("{numbers}, {sums}"), style.radius(3.0), points)
        })
    };
    let truncation = rows.iter().filter_map(|row| Some((row.dt, row.truncation?)));
    let panels = vec![
        panel("error of the depth", |errors| Some(errors.total)).series(
            "double-double: truncation",
            Style::line(0).ink(Ink::Muted),
            truncation,
        ),
        panel("rounding in it", |errors| errors.rounding),
    ];
    Some(Figure::new("rounding-floor", "", judged, &[&floors, &last.steps, &gain], panels)?.sharing_axes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrators::VelocityAt;

    #[test]
    fn the_largest_deviation_is_stated_above_the_theory_and_below() {
        for (measured, stated) in [([2.002, 1.99], "0.5"), ([2.01, 1.998], "0.5"), ([1.998, 2.0], "0.1")] {
            let point = |(index, measured)| BoundaryPoint {
                velocity: VelocityAt::Centred,
                drag_group: index as f64,
                measured,
                theory: 2.0,
            };
            let points: Vec<_> = measured.into_iter().enumerate().map(point).collect();
            let title = boundary(&points, &[]).map(|figure| figure.message);
            assert!(title.as_deref().is_some_and(|title| title.contains(&format!("within {stated}"))), "{title:?}");
        }
    }
}
