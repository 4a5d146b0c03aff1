//! The figures of sweeps, of the map of Eq. 11-12, and of measured depths.
//!
//! The commands `sweep`, `map` and `experiments` write them as files; the report of the suite shows the same ones.

use super::chart::{Anchor, Axis, HEIGHT, Ink, Key, KeyPlace, Mark, Panel, RADIUS, Scale, Shape};
use super::figure::{Figure, Part};
use super::table::{Table, or_empty};
use super::text::{count, number};
use crate::studies::applicability::{ERROR_ALLOWED, Line};
use crate::studies::experiments::{BAND, Comparison, MarkedScene, summaries};
use crate::studies::sweep::{Plan, Row};

/// A point (x, y).
pub type Point = (f64, f64);

/// Least H/d at which differences are drawn: for thinner slabs they run to thousands of percent and hide the rest.
const THICK: f64 = 1.0;

/// Lines of a family at most, the ends of the second axis among them.
const LINES_MAX: usize = 6;

/// Diagrams with a legend of their own and more to see than a fit.
const TALL: i32 = HEIGHT + 70;

fn line(points: Vec<Point>, ink: Ink, dashed: bool) -> Mark {
    Mark::Line { points, ink, dashed }
}

fn dots(points: Vec<Point>, ink: Ink, shape: Shape, radius: f64) -> Mark {
    Mark::Points { points, ink, shape, hollow: false, radius }
}

fn finite(points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

/// The points of `value` over H/d.
fn along(rows: &[Row], value: impl Fn(&Row) -> Option<f64>) -> Vec<Point> {
    finite(rows.iter().filter_map(|row| Some((row.thickness_ratio?, value(row)?))))
}

/// Least and greatest ordinate.
fn extremes(points: &[Point]) -> Option<[f64; 2]> {
    let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.1), h.max(p.1)));
    (low <= high).then_some([low, high])
}

/// `+12.3`.
fn signed(value: f64) -> String {
    let text = number(value, 3);
    if value > 0.0 { format!("+{text}") } else { text }
}

/// `energy` less `formula` in percent of it, over H/d.
fn difference(rows: &[Row], energy: impl Fn(&Row) -> Option<f64>, formula: impl Fn(&Row) -> Option<f64>) -> Vec<Point> {
    let points = along(rows, |row| Some(100.0 * (energy(row)? / formula(row)? - 1.0)));
    points.into_iter().filter(|(ratio, _)| *ratio >= THICK).collect()
}

/// The paper's Figure 4: `E_c/(d³ fc)` over H/d of the simulation by both criteria, Eq. 15, and measured `points`.
///
/// `None` where there is nothing to draw: no row has a finite energy.
pub fn critical_energy(rows: &[Row], points: &[Point]) -> Option<Figure> {
    let full = along(rows, |row| row.energy_full_depth);
    let ndrc = along(rows, |row| row.energy_ndrc);
    let printed = along(rows, |row| row.eq15_printed);
    let unrounded = along(rows, |row| row.eq15_unrounded);
    let all = || [&full, &ndrc, &printed].into_iter().flatten();
    extremes(&full)?;
    let mut table =
        Table::new(["H_over_d", "energy_full_depth", "energy_ndrc", "eq15_printed", "eq15_unrounded", "measured"]);
    for row in rows {
        table.push([
            &or_empty(row.thickness_ratio),
            &or_empty(row.energy_full_depth),
            &or_empty(row.energy_ndrc),
            &or_empty(row.eq15_printed),
            &or_empty(row.eq15_unrounded),
            &"",
        ]);
    }
    for (ratio, energy) in points {
        table.push([ratio, &"", &"", &"", &"", energy]);
    }
    let x = Axis::linear("H/d", all().chain(points).map(|p| p.0).chain([0.0]));
    let y = Axis::linear("E_c/(d³ f_c)", all().chain(points).map(|p| p.1).chain([0.0]));
    let mut keys = vec![
        Key::line("simulation, full depth x = H", Ink::Blue, false),
        Key::line("simulation, ndrc x = x_p(H)", Ink::Teal, false),
        Key::line("Eq. 15, printed", Ink::Orange, false),
        Key::line("Eq. 15, unrounded", Ink::Purple, true),
    ];
    let mut marks = vec![
        line(full, Ink::Blue, false),
        line(ndrc, Ink::Teal, false),
        line(printed, Ink::Orange, false),
        line(unrounded, Ink::Purple, true),
    ];
    if !points.is_empty() {
        keys.push(Key::points("measured", Ink::Red, Shape::Circle));
        marks.push(dots(points.to_vec(), Ink::Red, Shape::Circle, RADIUS));
    }
    let full = difference(rows, |row| row.energy_full_depth, |row| row.eq15_unrounded);
    let ndrc = difference(rows, |row| row.energy_ndrc, |row| row.eq15_unrounded);
    let gap = match (extremes(&full), extremes(&ndrc)) {
        (Some([low, high]), Some(other)) => format!(
            "the simulation through the whole thickness lies {}, that with its criterion within {} %",
            if low >= 0.0 {
                format!("{} to {} % above Eq. 15", number(low, 3), number(high, 3))
            } else {
                format!("{} to {} % off Eq. 15", signed(low), signed(high))
            },
            number(other[0].abs().max(other[1].abs()), 2),
        ),
        _ => "the simulation by both criteria, and Eq. 15".to_owned(),
    };
    Some(Figure {
        name: "critical-energy".into(),
        part: Part::Slab,
        message: format!("Critical impact energy over the thickness (Figure 4): {gap}"),
        reading: "Four lines over H/d: the equation of motion until x = H (full depth), the same until the depth from \
                  which the ACE/NDRC relation lets the rest fail (ndrc), and Eq. 15 as printed and before its \
                  coefficients were rounded. The percentages are of unrounded Eq. 15, from H/d = 1."
            .to_owned(),
        claims: Vec::new(),
        panels: vec![Panel {
            title: "critical impact energy".into(),
            description: format!("Dimensionless critical energy over H/d: {gap}."),
            x,
            y,
            marks,
            keys,
            key_place: KeyPlace::TopLeft,
            height: TALL,
        }],
        table,
    })
}

/// The paper's Figure 5: simulation less Eq. 15 in percent of Eq. 15, over H/d, by both criteria.
///
/// `None` where no row has H/d of at least one.
pub fn critical_energy_difference(rows: &[Row]) -> Option<Figure> {
    let full = difference(rows, |row| row.energy_full_depth, |row| row.eq15_printed);
    let printed = difference(rows, |row| row.energy_ndrc, |row| row.eq15_printed);
    let unrounded = difference(rows, |row| row.energy_ndrc, |row| row.eq15_unrounded);
    let ratios = [full.first()?.0, full.last()?.0];
    let mut table =
        Table::new(["H_over_d", "full_depth_over_printed", "ndrc_over_printed", "ndrc_over_unrounded", "N"]);
    for row in rows.iter().filter(|row| row.thickness_ratio.is_some_and(|ratio| ratio >= THICK)) {
        let over = |energy: Option<f64>, formula: Option<f64>| or_empty(energy.zip(formula).map(|(e, f)| e / f - 1.0));
        table.push([
            &or_empty(row.thickness_ratio),
            &over(row.energy_full_depth, row.eq15_printed),
            &over(row.energy_ndrc, row.eq15_printed),
            &over(row.energy_ndrc, row.eq15_unrounded),
            &or_empty(row.geometry),
        ]);
    }
    let least = full.iter().copied().fold(full[0], |least, point| if point.1 < least.1 { point } else { least });
    let [low, high] = extremes(&unrounded).unwrap_or([0.0, 0.0]);
    let geometry =
        rows.iter().find(|row| row.thickness_ratio.is_some()).and_then(|row| row.geometry).unwrap_or(f64::INFINITY);
    let x = Axis::linear("H/d", ratios);
    let panel = |title: &str, description: String, y: Axis, marks, keys| Panel {
        title: title.to_owned(),
        description,
        x: x.clone(),
        y,
        marks,
        keys,
        key_place: KeyPlace::TopRight,
        height: HEIGHT,
    };
    let greatest = full.iter().map(|p| p.1).fold(0.0, f64::max);
    let y_full = Axis::linear("difference [%]", full.iter().map(|p| p.1).chain([0.0, greatest]));
    // Room above the lines for the legend.
    let [bottom, top] = extremes(&[&printed[..], &unrounded].concat()).unwrap_or([0.0, 1.0]);
    let y_ndrc = Axis::linear("difference [%]", [bottom.min(0.0), top.max(0.0) + 0.3 * (top - bottom).max(0.1)]);
    Some(Figure {
        name: "critical-energy-difference".into(),
        part: Part::Slab,
        message: format!(
            "Difference from Eq. 15 (Figure 5), N = {}: {} % at the least with the whole thickness, {} to {} % with the \
             criterion of Eq. 15",
            number(geometry, 3),
            signed(least.1),
            signed(low),
            signed(high),
        ),
        reading: "Simulation less Eq. 15 in percent of Eq. 15, from H/d = 1. Left: exit at x = H. Right, on its own \
                  scale: exit at x_p(H). What the printed line has beyond the unrounded one are its rounded coefficients."
            .to_owned(),
        claims: Vec::new(),
        panels: vec![
            panel(
                "full depth",
                format!("From {} % to {} %, least at H/d = {}.", signed(full[0].1), signed(least.1), number(least.0, 3)),
                y_full,
                vec![line(ratios.map(|r| (r, 24.0)).to_vec(), Ink::Muted, true), line(full, Ink::Blue, false)],
                vec![
                    Key::line("x = H over Eq. 15, printed", Ink::Blue, false),
                    Key::line("+24 %: limit for N, H/d infinite", Ink::Muted, true),
                ],
            ),
            panel(
                "criterion ndrc",
                format!("Over unrounded Eq. 15 from {} % to {} %.", signed(low), signed(high)),
                y_ndrc,
                vec![line(printed, Ink::Orange, false), line(unrounded, Ink::Purple, true)],
                vec![
                    Key::line("x = x_p(H) over Eq. 15, printed", Ink::Orange, false),
                    Key::line("… over Eq. 15, unrounded", Ink::Purple, true),
                ],
            ),
        ],
        table,
    })
}

/// Critical velocity over the first axis of any sweep: one line, or up to six values of a second axis.
///
/// `None` where no point has one.
pub fn critical_velocity(plan: &Plan, rows: &[Row]) -> Option<Figure> {
    let [first, rest @ ..] = plan.axes() else { return None };
    let inner = rest.first().map_or(1, |axis| axis.count);
    let shown = inner.min(LINES_MAX);
    let mut table = Table::new(["first", "second", "critical_velocity_m_s"]);
    let (mut marks, mut keys, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for index in 0..shown {
        let column = if shown == 1 { 0 } else { index * (inner - 1) / (shown - 1) };
        let second = rest.first().map(|axis| axis.value(column));
        let points = finite((0..first.count).filter_map(|i| {
            let row = &rows[i * inner + column];
            Some((row.values[0], row.critical_velocity?))
        }));
        for (value, velocity) in &points {
            table.push([value, &or_empty(second), velocity]);
        }
        all.extend(points.iter().copied());
        // Four colours, then the same ones dashed.
        let (ink, dashed) = (Ink::series(index), index >= 4);
        marks.push(line(points, ink, dashed));
        if let (Some(axis), Some(value)) = (rest.first(), second) {
            keys.push(Key::line(format!("{} = {}", axis.parameter, number(value, 4)), ink, dashed));
        }
    }
    extremes(&all)?;
    let label = match first.parameter.dimension() {
        Some(dimension) => format!("{} [{}]", first.parameter, dimension.units()[0]),
        None => first.parameter.to_string(),
    };
    let paths: Vec<_> = plan.axes().iter().map(|axis| axis.parameter.to_string()).collect();
    Some(Figure {
        name: "critical-velocity".into(),
        part: Part::Slab,
        message: format!("Critical velocity over {}", paths.join(" and ")),
        reading: String::new(),
        claims: Vec::new(),
        panels: vec![Panel {
            title: "critical velocity".into(),
            description: format!("V_c over {}, {}.", first.parameter, count(shown, "line")),
            x: Axis::linear(label, all.iter().map(|p| p.0)),
            y: Axis::linear("V_c [m/s]", all.iter().map(|p| p.1)),
            marks,
            keys,
            key_place: KeyPlace::Corner,
            height: TALL,
        }],
        table,
    })
}

/// Points of one set after the other, in the order of their first appearance.
fn by_set<T>(items: &[T], set_of: impl Fn(&T) -> String) -> Vec<(String, Vec<&T>)> {
    let mut sets: Vec<(String, Vec<&T>)> = Vec::new();
    for item in items {
        let set = set_of(item);
        match sets.iter_mut().find(|(known, _)| *known == set) {
            Some((_, members)) => members.push(item),
            None => sets.push((set, vec![item])),
        }
    }
    sets
}

/// The map of Eq. 11-12 over (I, N) for one k: lines of equal error, and the scenes of measured sets.
pub fn applicability(crater_ratio: f64, lines: &[Line], scenes: &[MarkedScene]) -> Figure {
    let mut table = Table::new(["kind", "level", "set", "I", "N", "k", "error"]);
    for found in lines {
        for (impact, geometry) in &found.points {
            table.push([&"line", &found.level, &"", impact, geometry, &crater_ratio, &""]);
        }
    }
    for scene in scenes {
        table.push([&"shot", &"", &scene.set, &scene.impact, &scene.geometry, &scene.crater_ratio, &scene.error]);
    }
    let x = Axis { label: "I".into(), scale: Scale::Log, range: [0.01, 1000.0], numbered: true };
    // Room above for the legend: the lines meet the upper edge at the right only.
    let y = Axis { label: "N".into(), scale: Scale::Log, range: [0.1, 100_000.0], numbered: true };
    let mut marks = Vec::new();
    for found in lines {
        let seen: Vec<Point> = found.points.iter().copied().filter(|(i, n)| x.holds(*i) && y.holds(*n)).collect();
        // The name of a line stands where the line leaves the panel, or begins.
        let is_crater = seen.last().is_some_and(|p| p.0 < 2.0 * crater_ratio);
        let (at, anchor) = match (seen.first(), seen.last(), is_crater) {
            (Some(first), _, true) => ((first.0 * 1.15, first.1 * 0.7), Anchor::Start),
            (_, Some(last), false) => ((last.0 * 0.8, last.1 * 0.75), Anchor::End),
            _ => continue,
        };
        let text = format!("{} %", number(100.0 * found.level, 3));
        marks.push(line(seen, Ink::Muted, is_crater));
        marks.push(Mark::Text { at, text, ink: Ink::Text, anchor });
    }
    let mut keys =
        vec![Key::line("Eq. 12 too deep", Ink::Muted, false), Key::line("Eq. 11 too shallow", Ink::Muted, true)];
    for (index, (set, members)) in by_set(scenes, |scene| scene.set.clone()).into_iter().enumerate() {
        let (ink, shape) = (Ink::series(index), Shape::series(index));
        marks.push(dots(members.iter().map(|s| (s.impact, s.geometry)).collect(), ink, shape, 2.5));
        keys.push(Key::points(set, ink, shape));
    }
    let within = scenes.iter().filter(|scene| scene.error.abs() <= ERROR_ALLOWED).count();
    Figure {
        name: "applicability-map".into(),
        part: Part::Applicability,
        message: format!(
            "Eq. 11-12 is within {} % of the equation of motion for {within} of {}",
            number(100.0 * ERROR_ALLOWED, 2),
            count(scenes.len(), "measured shot"),
        ),
        reading: format!(
            "Lines of equal error of the depth of Eq. 11-12 for k = {}; above a line the error is smaller. It vanishes at \
             I = k π/4 for every N. Points are the measured shots, counted by their own k.",
            number(crater_ratio, 3)
        ),
        claims: Vec::new(),
        panels: vec![Panel {
            title: "error of Eq. 11-12 over I and N".into(),
            description: format!(
                "Lines of 1, 5 and 20 % error over impact function I and geometry function N, and {} of {}.",
                count(scenes.len(), "measured shot"),
                count(keys.len() - 2, "set"),
            ),
            x,
            y,
            marks,
            keys,
            key_place: KeyPlace::TopLeft,
            height: TALL + 40,
        }],
        table,
    }
}

/// Predicted over measured depth [m] with the band of ±20 %; one kind of mark for each set.
///
/// `None` without a shot.
pub fn measured_depths(comparisons: &[Comparison]) -> Option<Figure> {
    let depths = comparisons.iter().flat_map(|c| [c.shot.depth, c.predicted]).filter(|depth| *depth > 0.0);
    let [low, high] = extremes(&depths.map(|depth| (0.0, depth)).collect::<Vec<_>>())?;
    let axis = |label: &str| Axis::log(label, [low, high]);
    let (x, y) = (axis("measured depth [m]"), axis("predicted depth [m]"));
    let ends = x.range;
    let corners = |factor: f64| ends.map(|depth| (depth, factor * depth));
    let [lower, upper] = [corners(1.0 - BAND), corners(1.0 + BAND)];
    let mut marks = vec![
        Mark::Area { points: vec![lower[0], upper[0], upper[1], lower[1]], ink: Ink::Shade },
        line(corners(1.0).to_vec(), Ink::Muted, true),
    ];
    let mut keys = vec![Key::line("equal; shaded: ±20 %", Ink::Muted, true)];
    for (index, (set, members)) in by_set(comparisons, Comparison::group).into_iter().enumerate() {
        let (ink, shape) = (Ink::series(index), Shape::series(index));
        marks.push(dots(members.iter().map(|c| (c.shot.depth, c.predicted)).collect(), ink, shape, 2.5));
        keys.push(Key::points(set, ink, shape));
    }
    let within: usize = summaries(comparisons).iter().map(|set| set.within_band).sum();
    Some(Figure {
        name: "measured-depths".into(),
        part: Part::Measured,
        message: format!(
            "Predicted depth is within {} % of the measured one for {within} of {}",
            number(100.0 * BAND, 2),
            count(comparisons.len(), "shot"),
        ),
        reading: "Each point is one shot: S of Eq. 14, N* of its nose, semi-infinite target. On the dashed line \
                  prediction and measurement are equal; shaded is the band of ±20 %."
            .to_owned(),
        claims: Vec::new(),
        panels: vec![Panel {
            title: "predicted over measured depth".into(),
            description: format!("{within} of {} lie within the band.", count(comparisons.len(), "point")),
            x,
            y,
            marks,
            keys,
            key_place: KeyPlace::TopLeft,
            height: TALL + 40,
        }],
        table: measured_table(comparisons),
    })
}

/// The comparison of measured shots, one row a shot.
pub fn measured_table(comparisons: &[Comparison]) -> Table {
    let mut table = Table::new([
        "test_set",
        "line",
        "velocity_m_s",
        "measured_depth_m",
        "predicted_depth_m",
        "ratio",
        "I",
        "N",
        "k",
        "comparison_error_m",
        "numerical_uncertainty_m",
        "input_uncertainty_m",
        "data_uncertainty_m",
        "validation_uncertainty_m",
    ]);
    for c in comparisons {
        table.push([
            &c.shot.set,
            &c.shot.line,
            &c.shot.velocity,
            &c.shot.depth,
            &c.predicted,
            &c.ratio(),
            &c.impact,
            &or_empty(c.geometry),
            &c.crater_ratio,
            &c.comparison_error(),
            &c.numerical_uncertainty,
            &or_empty(c.input_uncertainty),
            &or_empty(c.shot.depth_uncertainty),
            &or_empty(c.validation_uncertainty()),
        ]);
    }
    table
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::studies::{applicability, experiments};

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
        let file = |points: &[Point]| critical_energy(&rows, points).unwrap().draw().unwrap().file();
        assert_eq!(file(&[(2.0, 5.0)]), file(&[(2.0, 5.0)]));
        assert_ne!(file(&[(2.0, 5.0)]), file(&[]));
        assert!(file(&[(2.0, 5.0)]).contains("E_c/(d³ f_c)") && file(&[(2.0, 5.0)]).contains("measured"));
    }

    #[test]
    fn nothing_finite_is_no_figure() {
        assert_eq!(critical_energy(&[], &[]), None);
        assert_eq!(critical_energy(&[row(1.0, f64::NAN)], &[]), None);
        assert_eq!(critical_energy_difference(&[row(0.5, 1.0)]), None);
        assert_eq!(measured_depths(&[]), None);
    }

    #[test]
    fn a_single_point_has_a_figure() {
        let file = critical_energy(&[row(5.0, 40.0)], &[]).unwrap().draw().unwrap().file();
        assert!(file.trim_end().ends_with("</svg>"));
    }

    /// What is said of the lines is computed from them.
    #[test]
    fn the_message_gives_the_gap_and_what_is_left_of_it() {
        let figure = critical_energy(&[row(1.0, 2.0), row(2.0, 9.0)], &[]).unwrap();
        assert!(figure.message.contains("100 to 100 % above Eq. 15"), "{}", figure.message);
        let figure = critical_energy_difference(&[row(1.0, 2.0), row(2.0, 9.0)]).unwrap();
        assert!(figure.message.contains("+100 % at the least"), "{}", figure.message);
    }

    #[test]
    fn the_map_names_its_lines_and_holds_every_shot() {
        let scenes = experiments::marked(&experiments::shipped().unwrap());
        let figure = super::applicability(2.0, &applicability::lines(2.0), &scenes);
        let file = figure.clone().draw().unwrap().file();
        for words in ["1 %", "5 %", "20 %", "Sliter1980", "Eq. 12 too deep"] {
            assert!(file.contains(words), "{words}");
        }
        assert_eq!(scenes.len(), 107);
        assert!(figure.table.len() > 107);
    }
}
