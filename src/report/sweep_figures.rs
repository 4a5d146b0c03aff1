//! The figures of sweeps, of the map of Eq. 11-12, and of measured depths.
//!
//! The commands `sweep`, `map` and `experiments` write them as files; the report of the suite shows the same ones.

use std::fmt::Display;

use super::chart::{Anchor, Axis, Ink, Panel, Point, Style, extremes};
use super::figure::Figure;
use super::text::{count, number, one_line};
use crate::exchange::tables::{Value, push_line};
use crate::physics::semi_empirical::{NDRC_FIRST_BRANCH_END, eq15_printed, eq15_unrounded, jumps};
use crate::studies::applicability::{ERROR_ALLOWED, Line};
use crate::studies::experiments::perforation::{PerforationTest, Perforations};
use crate::studies::experiments::{BAND, Comparison, MarkedScene, Shots, summaries};
use crate::studies::formulas::Said;
use crate::studies::sweep::{self, MeasuredPoint, Plan, Row};
use crate::suite::{Judged, grouped};

/// Least H/d at which differences are drawn: for thinner slabs they run to thousands of percent and hide the rest.
const THICK: f64 = 1.0;

/// Lines of a family at most, the ends of the second axis among them.
const LINES_MAX: usize = 6;

/// Height of a diagram that stands alone.
const TALL: f64 = 250.0;

/// The finite points of `value` over H/d.
fn along(rows: &[Row], value: impl Fn(&Row) -> Option<f64>) -> Vec<Point> {
    let points = rows.iter().filter_map(|row| Some((row.thickness_ratio?, value(row)?)));
    points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

/// Least and greatest ordinate.
fn heights(points: &[Point]) -> Option<[f64; 2]> {
    extremes(points.iter().map(|point| point.1))
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
pub fn critical_energy(rows: &[Row], points: &[Point], judged: &[&Judged]) -> Option<Figure> {
    let full = difference(rows, |row| row.energy_full_depth, |row| row.eq15_unrounded);
    let ndrc = difference(rows, |row| row.energy_ndrc, |row| row.eq15_unrounded);
    let range = |points: &[Point]| heights(points).map_or_else(|| "—".to_owned(), |ends| ends.map(signed).join(" to "));
    let (full, ndrc) = (range(&full), range(&ndrc));
    let energies = along(rows, |row| row.energy_full_depth);
    heights(&energies)?;
    let origin = |title| Axis::linear(title, "").including([0.0]);
    let panel = Panel::new("critical impact energy", origin("H/d"), origin("E_c/(d³ f_c)"))
        .series("Eq. 15, unrounded", Style::line(2).wide(), along(rows, |row| row.eq15_unrounded))
        .series("Eq. 15, printed", Style::line(1), along(rows, |row| row.eq15_printed))
        .series("simulation, ndrc x = x_p(H)", Style::line(3), along(rows, |row| row.energy_ndrc))
        .series("simulation, full depth x = H", Style::line(0), energies)
        .tall(TALL);
    let measured = Style::marks(0).ink(Ink::Red);
    let panel = if points.is_empty() { panel } else { panel.series("measured", measured, points.iter().copied()) };
    let rounding = rounding_of_eq15(rows);
    let [at_3, at_38] = jumps().map(|jump| signed(100.0 * (jump.above / jump.below - 1.0)));
    let end = NDRC_FIRST_BRANCH_END;
    let own = signed(100.0 * (eq15_unrounded(end * (1.0 + 1e-9)) / eq15_unrounded(end * (1.0 - 1e-9)) - 1.0));
    let right = rounding.as_ref().map_or_else(String::new, |_| {
        format!(
            " Second panel: what the printed coefficients alone change. Printed, Eq. 15 jumps by {at_3} % at H/d = 3 and by {at_38} % at \
             3.8; unrounded, by {own} % just below 3, with the ACE/NDRC relation."
        )
    });
    let panels = [panel].into_iter().chain(rounding).collect();
    Figure::new("critical-energy", "", judged, &[&full, &ndrc, &right], panels)
}

/// Printed less unrounded Eq. 15 in percent of it about the places where the branches meet, drawn apart there; `None` where
/// `rows` do not reach them.
fn rounding_of_eq15(rows: &[Row]) -> Option<Panel> {
    /// H/d at which it begins and ends.
    const SHOWN: [f64; 2] = [2.0, 6.0];
    /// Points from one jump to the next.
    const POINTS: u32 = 40;
    let [first, last] =
        extremes(rows.iter().filter(|row| row.eq15_unrounded.is_some()).filter_map(|row| row.thickness_ratio))?;
    let (first, last) = (first.max(SHOWN[0]), last.min(SHOWN[1]));
    let meet = jumps().map(|jump| jump.thickness_ratio);
    // Just below 3 the unrounded line has a jump of its own: what lies between is too short to be seen.
    let branches = [[first, NDRC_FIRST_BRANCH_END], meet, [meet[1], last]];
    if branches.iter().any(|[from, to]| from >= to) {
        return None;
    }
    let panel = Panel::new("Eq. 15: rounding", Axis::linear("H/d", ""), Axis::linear("printed less unrounded", "%"));
    let panel = panel.tall(TALL).upright("H/d = 3", meet[0]).upright("H/d = 3.8", meet[1]);
    Some(branches.into_iter().fold(panel, |panel, [from, to]| {
        let points = (0..=POINTS).map(|part| {
            // Within the branch: at its ends another one begins.
            let share = (f64::from(part) / f64::from(POINTS)).clamp(1e-9, 1.0 - 1e-9);
            let ratio = from + share * (to - from);
            (ratio, 100.0 * (eq15_printed(ratio) / eq15_unrounded(ratio) - 1.0))
        });
        panel.series("printed less unrounded, of unrounded", Style::line(1).as_line(), points)
    }))
}

/// Simulation less Eq. 15 in percent of Eq. 15, over H/d, by both criteria; and where energies are `measured`, the paper's
/// Figure 5: each curve in percent of them.
///
/// `None` where no row has H/d of at least one.
pub fn critical_energy_difference(rows: &[Row], measured: &[MeasuredPoint], judged: &[&Judged]) -> Option<Figure> {
    let full = difference(rows, |row| row.energy_full_depth, |row| row.eq15_printed);
    let printed = difference(rows, |row| row.energy_ndrc, |row| row.eq15_printed);
    let unrounded = difference(rows, |row| row.energy_ndrc, |row| row.eq15_unrounded);
    let [least, _] = heights(&full)?;
    let [low, high] = heights(&unrounded).unwrap_or([0.0, 0.0]);
    let geometry =
        rows.iter().find(|row| row.thickness_ratio.is_some()).and_then(|row| row.geometry).unwrap_or(f64::INFINITY);
    let panel = |title| Panel::new(title, Axis::linear("H/d", ""), Axis::linear("difference", "%").including([0.0]));
    let limit: Vec<Point> = full.iter().map(|(ratio, _)| (*ratio, 24.0)).collect();
    let panels =
        vec![
            panel("full depth").series("+24 %: limit for N, H/d infinite", Style::REFERENCE, limit).series(
                "x = H over Eq. 15, printed",
                Style::line(0),
                full,
            ),
            panel("criterion ndrc")
                .series("x = x_p(H) over Eq. 15, unrounded", Style::line(2).wide(), unrounded)
                .series("the same over Eq. 15, printed", Style::line(1), printed),
        ];
    let values = [&number(geometry, 3) as &dyn Display, &signed(least), &signed(low), &signed(high)];
    let over_measured = |curve: fn(&MeasuredPoint) -> Option<f64>| {
        let point =
            |point: &MeasuredPoint| Some((point.thickness_ratio, 100.0 * (curve(point)? / point.measured - 1.0)));
        measured.iter().filter_map(point).filter(|(_, y)| y.is_finite()).collect::<Vec<Point>>()
    };
    let figure_5 = (!measured.is_empty()).then(|| {
        panel("over measured energies (Figure 5)")
            .series("simulation, x = H", Style::marks(0), over_measured(|point| point.energy_full_depth))
            .series("simulation, x = x_p(H)", Style::marks(2), over_measured(|point| point.energy_ndrc))
            .series("Eq. 15, printed", Style::marks(1), over_measured(|point| point.eq15_printed))
    });
    let panels = panels.into_iter().chain(figure_5).collect();
    Figure::new("critical-energy-difference", "", judged, &values, panels)
}

/// Critical velocity over the first axis of any sweep: one line, or up to six values of a second axis.
///
/// `None` where no point has one.
pub fn critical_velocity(plan: &Plan, rows: &[Row]) -> Option<Figure> {
    let [first, rest @ ..] = plan.axes() else { return None };
    let inner = rest.first().map_or(1, |axis| axis.count);
    let shown = inner.min(LINES_MAX);
    let unit = first.parameter.entry().dimension.map_or("", |dimension| dimension.units()[0]);
    let axis = if first.logarithmic { Axis::log } else { Axis::linear };
    let x = axis(&first.parameter.to_string(), unit);
    let mut panel = Panel::new("critical velocity", x, Axis::linear("V_c", "m/s")).tall(TALL);
    for index in 0..shown {
        let column = if shown == 1 { 0 } else { index * (inner - 1) / (shown - 1) };
        let points = (0..first.count).filter_map(|i| {
            let row = &rows[i * inner + column];
            Some((row.values[0], row.critical_velocity_m_s?))
        });
        let name = |axis: &sweep::Axis| format!("{} = {}", axis.parameter, number(axis.value(column), 4));
        panel = panel.series(rest.first().map_or_else(String::new, name), Style::line(index), points);
    }
    let paths: Vec<_> = plan.axes().iter().map(|axis| axis.parameter.to_string()).collect();
    Figure::new("critical-velocity", "", &[], &[&paths.join(" and ")], vec![panel])
}

/// The map of Eq. 11-12 over (I, N) for one k: lines of equal error, and the scenes of measured sets.
pub fn applicability(crater_ratio: f64, lines: &[Line], scenes: &[MarkedScene], judged: &[&Judged]) -> Option<Figure> {
    let (x, y) = ([0.01, 1000.0], [0.1, 1e5]);
    let mut panel =
        Panel::new("error of Eq. 11-12 over I and N", Axis::log("I", "").over(x), Axis::log("N", "").over(y))
            .tall(290.0);
    for found in lines {
        let is_seen = |(i, n): &Point| (x[0]..=x[1]).contains(i) && (y[0]..=y[1]).contains(n);
        let seen: Vec<Point> = found.points.iter().copied().filter(is_seen).collect();
        let (Some(first), Some(last)) = (seen.first(), seen.last()) else { continue };
        // The name of a line stands where the line begins, or where it leaves the panel.
        let level = format!("{} %", number(100.0 * found.level, 3));
        panel = if last.0 < 2.0 * crater_ratio {
            let at = (first.0 * 1.15, first.1 * 0.75);
            panel.label(at, level, Anchor::Start).series("Eq. 11 too shallow", Style::REFERENCE, seen)
        } else {
            let at = (last.0 * 0.8, last.1 * 0.75);
            panel.label(at, level, Anchor::End).series("Eq. 12 too deep", Style::line(0).ink(Ink::Muted), seen)
        };
    }
    for (index, (set, members)) in grouped(scenes, |scene| scene.set.clone()).into_iter().enumerate() {
        panel = panel.series(set, Style::marks(index).radius(2.5), members.iter().map(|s| (s.impact, s.geometry)));
    }
    let within = scenes.iter().filter(|scene| scene.error.abs() <= ERROR_ALLOWED).count();
    let (allowed, tests) = (number(100.0 * ERROR_ALLOWED, 2), count(scenes.len(), "measured test"));
    let values = [&allowed as &dyn Display, &within, &tests, &number(crater_ratio, 3)];
    Figure::new("applicability-map", "", judged, &values, vec![panel])
}

/// Perforation limits (m) over the impact velocity (m/s) by the equation of motion and the formulas that are confirmed.
///
/// `None` where none has a number.
pub fn perforation_limits(rows: &[(f64, Vec<Said>)]) -> Option<Figure> {
    let (_, first) = rows.first()?;
    let names = first.iter().filter(|said| said.confirmed).map(|said| said.name.clone());
    let panel = Panel::new(
        "perforation limit",
        Axis::linear("impact velocity", "m/s"),
        Axis::linear("thickness that just stops", "m").including([0.0]),
    );
    let (mut panel, mut drawn, mut left_out) = (panel.tall(TALL), 0, 0);
    left_out += first.iter().filter(|said| !said.confirmed).count();
    for name in names {
        let at = |(speed, said): &(f64, Vec<Said>)| {
            Some((*speed, said.iter().find(|said| said.name == name)?.perforation_m?))
        };
        let points: Vec<Point> = rows.iter().filter_map(at).collect();
        if !points.is_empty() {
            panel = panel.series(name, Style::line(drawn), points);
            drawn += 1;
        }
    }
    let values = [&left_out as &dyn Display];
    if drawn == 0 { None } else { Figure::new("perforation-limits", "", &[], &values, vec![panel]) }
}

/// Predicted over measured depth (m) with the band of ±20 %; one kind of mark for each set.
///
/// `None` without a test.
pub fn measured_depths(comparisons: &[Comparison], judged: &[&Judged]) -> Option<Figure> {
    let depths = comparisons
        .iter()
        .flat_map(|c| [c.experiment.measured_depth_m, c.predicted_depth_m])
        .filter(|depth| *depth > 0.0);
    let [low, high] = extremes(depths)?;
    let ends = [low / 1.5, high * 1.5];
    let axis = |title| Axis::log(title, "m").over(ends);
    // Cut at the edges of the diagram: a corner beyond them would be drawn on them, and its side lean.
    let [from, to] = ends;
    let band = [
        (from, from),
        (from, from * (1.0 + BAND)),
        (to / (1.0 + BAND), to),
        (to, to),
        (to, to * (1.0 - BAND)),
        (from / (1.0 - BAND), from),
    ];
    let mut panel = Panel::new("predicted over measured depth", axis("measured depth"), axis("predicted depth"))
        .series("±20 %", Style::area(Ink::Shade), band)
        .series("equal", Style::REFERENCE, ends.map(|depth| (depth, depth)))
        .tall(290.0);
    for (index, (set, members)) in grouped(comparisons, |c| c.group()).into_iter().enumerate() {
        let points = members.iter().map(|c| (c.experiment.measured_depth_m, c.predicted_depth_m));
        panel = panel.series(set, Style::marks(index).radius(2.5), points);
    }
    let within: usize = summaries(comparisons).iter().map(|set| set.within_20_percent).sum();
    let values = [&number(100.0 * BAND, 2) as &dyn Display, &within, &count(comparisons.len(), "test")];
    let panels = [panel].into_iter().chain(ratios(comparisons)).collect();
    Figure::new("measured-depths", "", judged, &values, panels)
}

/// Predicted over measured depth over X/d, the strength and the diameter; outliers by set and line.
fn ratios(comparisons: &[Comparison]) -> impl Iterator<Item = Panel> {
    type Over = (&'static str, &'static str, fn(&Comparison) -> f64);
    const OVER: [Over; 3] = [
        ("measured X/d", "", |c| c.experiment.measured_depth_m / c.experiment.concrete.diameter),
        ("strength", "MPa", |c| 1e-6 * c.experiment.concrete.strength),
        ("diameter", "mm", |c| 1e3 * c.experiment.concrete.diameter),
    ];
    OVER.into_iter().map(move |(title, unit, over)| {
        let [least, most] = extremes(comparisons.iter().map(over)).unwrap_or([1.0, 1.0]);
        let ends = [least / 1.5, most * 1.5];
        let band = [(ends[0], 1.0 - BAND), (ends[0], 1.0 + BAND), (ends[1], 1.0 + BAND), (ends[1], 1.0 - BAND)];
        let mut panel = Panel::new(
            format!("ratio over {title}"),
            Axis::log(title, unit).over(ends),
            Axis::log("predicted over measured", ""),
        )
        .series("±20 %", Style::area(Ink::Shade), band)
        .series("equal", Style::REFERENCE, ends.map(|x| (x, 1.0)))
        .tall(290.0);
        for (index, (set, members)) in grouped(comparisons, |c| c.group()).into_iter().enumerate() {
            panel = panel.series(set, Style::marks(index).radius(2.5), members.iter().map(|c| (over(c), c.ratio)));
        }
        for c in comparisons.iter().filter(|c| c.is_outlier) {
            panel = panel.name((over(c), c.ratio), format!("line {}", c.experiment.line));
        }
        panel
    })
}

/// Shots as CSV: each in the order of `shots`, measured beside predicted, and the columns of its table that are not read.
pub fn measured_table(shots: &Shots, comparisons: &[Comparison], perforations: &Perforations) -> String {
    const NAMES: [&str; 22] = [
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
        "is_outlier",
        "measured_outcome",
        "predicted_outcome",
        "measured_residual_m_s",
        "predicted_residual_m_s",
        "measured_limit_m_s",
        "predicted_limit_m_s",
        "excluded",
    ];
    let others: Vec<String> = shots
        .others
        .iter()
        .map(|name| if NAMES.contains(&name.as_str()) { format!("given_{name}") } else { name.clone() })
        .collect();
    let mut csv = String::new();
    let names = NAMES.iter().copied().chain(others.iter().map(String::as_str));
    push_line(&mut csv, &names.map(Value::Text).collect::<Vec<_>>());
    let (mut depths, mut fired, mut limits) =
        (comparisons.iter(), perforations.shots.iter(), perforations.limits.iter());
    let word = |perforated: Option<bool>| match perforated {
        Some(true) => "perforated",
        Some(false) => "stopped",
        None => "",
    };
    for shot in &shots.shots {
        let is_used = shot.excluded.is_none();
        let has_far_side = is_used && shot.scene.thickness.is_some();
        let c = if is_used && shot.depth.is_some() { depths.next() } else { None };
        let test = if has_far_side && shot.perforated.is_some() { fired.next() } else { None };
        let limit = if has_far_side && shot.limit.is_some() { limits.next() } else { None };
        let numbers = [
            shot.scene.velocity,
            shot.depth.map(|depth| depth.value),
            c.map(|c| c.predicted_depth_m),
            c.map(|c| c.ratio),
            c.map(|c| c.impact),
            c.and_then(|c| c.geometry),
            c.map(|c| c.crater_ratio),
            c.map(|c| c.comparison_error_m),
            c.map(|c| c.numerical_uncertainty_m),
            c.and_then(|c| c.input_uncertainty_m),
            c.and_then(|c| c.experiment.data_uncertainty_m),
            c.and_then(|c| c.validation_uncertainty_m),
        ];
        let velocities = [
            shot.residual.map(|residual| residual.value),
            test.map(|test| test.predicted_velocity_m_s),
            shot.limit.map(|limit| limit.value),
            limit.map(|limit| limit.predicted_limit_m_s),
        ];
        let mut row = vec![Value::Text(&shot.set), Value::Count(shot.line)];
        row.extend(numbers.map(Value::Number));
        row.push(Value::Text(match c {
            Some(c) if c.is_outlier => "yes",
            Some(_) => "no",
            None => "",
        }));
        let predicted = match test {
            Some(PerforationTest { predicted_perforation: None, .. }) => "undecided",
            Some(test) => word(test.predicted_perforation),
            None => "",
        };
        row.extend([Value::Text(word(shot.perforated)), Value::Text(predicted)]);
        row.extend(velocities.map(Value::Number));
        row.push(Value::Text(shot.excluded.as_deref().unwrap_or("")));
        row.extend(shot.others.iter().map(|cell| Value::Text(cell)));
        push_line(&mut csv, &row);
    }
    csv
}

/// Residual over impact velocity, measured and predicted, a panel for each group with a curve through its shots.
///
/// `None` without such a group.
pub fn residual_velocities(perforations: &Perforations) -> Option<Figure> {
    /// Points of a curve.
    const POINTS: u32 = 200;
    let fitted =
        perforations.groups.iter().filter_map(|group| Some((group, group.lambert_jonas.or(group.recht_ipson)?)));
    let panels: Vec<Panel> = fitted
        .map(|(group, fit)| {
            let of_group = || {
                let in_group = |test: &&PerforationTest| {
                    test.set == group.set && test.thickness_m == group.thickness_m && group.lines.contains(&test.line)
                };
                perforations.shots.iter().filter(in_group)
            };
            let measured = of_group().filter_map(|test| Some((test.velocity_m_s, test.measured_velocity_m_s?)));
            let stopped = of_group().filter(|test| !test.measured_perforation).map(|test| (test.velocity_m_s, 0.0));
            let predicted = of_group().map(|test| (test.velocity_m_s, test.predicted_velocity_m_s));
            let fastest = of_group().map(|test| test.velocity_m_s).fold(0.0, f64::max);
            let least = fit.limit_m_s.value;
            let curve = (0..=POINTS).map(|part| {
                // Denser where the curve rises from the axis.
                let speed = least + (fastest - least) * (f64::from(part) / f64::from(POINTS)).powi(2);
                (speed, fit.at(speed))
            });
            let [d, h] = [group.diameter_m, group.thickness_m].map(|length| number(1e3 * length, 4));
            let title = format!("{}, d {d} mm, H {h} mm", one_line(&group.set));
            Panel::new(
                title,
                Axis::linear("impact velocity", "m/s"),
                Axis::linear("residual velocity", "m/s").including([0.0]),
            )
            .tall(TALL)
            .series("curve through the shots", Style::line(0), curve)
            .series("measured", Style::marks(0), measured)
            .series("stopped", Style::marks(0).hollow(), stopped)
            .series("predicted", Style::marks(1), predicted)
        })
        .collect();
    let errors: Vec<String> = perforations
        .groups
        .iter()
        .filter_map(|group| {
            let fit = group.lambert_jonas.or(group.recht_ipson)?;
            Some(format!("{} against {} m/s", number(group.predicted_limit_m_s, 4), number(fit.limit_m_s.value, 4)))
        })
        .collect();
    if panels.is_empty() { None } else { Figure::new("residual-velocities", "", &[], &[&errors.join(", ")], panels) }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::Taylor;
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
        let file = |points: &[Point]| critical_energy(&rows, points, &[]).unwrap().file();
        assert_eq!(file(&[(2.0, 5.0)]), file(&[(2.0, 5.0)]));
        assert_ne!(file(&[(2.0, 5.0)]), file(&[]));
        assert!(file(&[(2.0, 5.0)]).contains("E_c/(d³ f_c)") && file(&[(2.0, 5.0)]).contains("measured"));
    }

    #[test]
    fn nothing_finite_is_no_figure() {
        assert_eq!(critical_energy(&[], &[], &[]), None);
        assert_eq!(critical_energy(&[row(1.0, f64::NAN)], &[], &[]), None);
        assert_eq!(critical_energy_difference(&[row(0.5, 1.0)], &[], &[]), None);
        assert_eq!(measured_depths(&[], &[]), None);
    }

    /// Lines that coincide in the drawing of energies are shown apart beside it, about the jumps of Eq. 15.
    #[test]
    fn the_jumps_of_eq15_are_drawn_where_the_sweep_reaches_them() {
        let panels = |ratios: &[f64]| {
            let rows: Vec<Row> = ratios.iter().map(|ratio| row(*ratio, 2.0 * ratio)).collect();
            critical_energy(&rows, &[], &[]).unwrap().panels.len()
        };
        assert_eq!([panels(&[1.0, 18.0]), panels(&[1.0, 3.5]), panels(&[4.0, 18.0])], [2, 1, 1]);
    }

    #[test]
    fn a_single_point_has_a_figure() {
        let file = critical_energy(&[row(5.0, 40.0)], &[], &[]).unwrap().file();
        assert!(file.trim_end().ends_with("</svg>"));
    }

    /// What is said of the lines is computed from them.
    #[test]
    fn the_message_gives_the_gap_and_what_is_left_of_it() {
        let figure = critical_energy(&[row(1.0, 2.0), row(2.0, 9.0)], &[], &[]).unwrap();
        assert!(figure.message.contains("+100 to +100 % off Eq. 15"), "{}", figure.message);
        let figure = critical_energy_difference(&[row(1.0, 2.0), row(2.0, 9.0)], &[], &[]).unwrap();
        assert!(figure.message.contains("+100 % at the least"), "{}", figure.message);
    }

    /// Two projectiles of one set at targets of one thickness.
    #[test]
    fn a_panel_of_residual_velocities_shows_the_shots_of_its_group_alone() {
        let shot = |d_mm: u32, speed: f64, residual: f64| format!("1,{d_mm},flat,40,2300,100,{speed},{residual}\n");
        let shots: String = [20, 40]
            .map(|d| {
                [1.1, 1.3, 1.6, 2.0].map(|over: f64| shot(d, 200.0 * over, 190.0 * (over * over - 1.0).sqrt())).concat()
            })
            .concat();
        let table = format!("M_kg,d_mm,nose,fc_MPa,rho_kg_m3,H_mm,V0_m_s,Vr_m_s\n{shots}");
        let shots = experiments::shot::read("own.csv", table.as_bytes(), "own").unwrap().shots;
        let perforations = Perforations::of(&shots, None, &[], &Taylor::default()).unwrap();
        let figure = residual_velocities(&perforations).unwrap();
        let table = figure.table();
        let measured =
            |panel: &str| table.lines().filter(|line| line.contains(panel) && line.contains("measured")).count();
        assert_eq!([measured("d 20 mm"), measured("d 40 mm")], [4, 4], "{table}");
    }

    #[test]
    fn the_map_names_its_lines_and_holds_every_test() {
        let scenes = experiments::marked(&experiments::shipped().unwrap());
        let figure = super::applicability(2.0, &applicability::lines(2.0), &scenes, &[]).unwrap();
        let file = figure.file();
        for words in ["1\u{a0}%", "5\u{a0}%", "20\u{a0}%", "Sliter1980", "Eq. 12 too deep"] {
            assert!(file.contains(words), "{words}");
        }
        assert_eq!(scenes.len(), 105);
        assert!(figure.table().lines().count() > 107);
    }
}
