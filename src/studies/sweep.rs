//! How do the critical velocity, depth and residual velocity move along one number of a scene, or over two?
//!
//! Along H/d this is the paper's result: `E_c/(d³ fc)` of the simulation beside Eq. 15 (its Figure 4), and their
//! difference in percent of Eq. 15 (its Figure 5 is in percent of measured energies). A sweep computes both criteria there, and so shows what the gap consists of: the
//! simulation asks for a path through the whole thickness, Eq. 15 for the depth from which the rest of the slab fails
//! (docs/theory.md, section 4). With Q = 0 and the criterion `ndrc` the equation of motion *is* unrounded Eq. 15.

mod conclusions;

use rayon::prelude::*;
use serde::{Serialize, Serializer};
use smallvec::SmallVec;
use thiserror::Error;

pub use self::conclusions::{Conclusion, MeasuredPoint, Side, Standing, bound, conclusions, falls};
use super::critical_velocity;
use super::enclosure::{self, Bounds};
use super::error::{Studied, StudyError};
use crate::exchange::tables::{self, Column, Format, Kind, Others, TableError, Value};
use crate::integrators::{Detail, Integrator, MethodName};
use crate::physics::decimals::Written;
use crate::physics::expression::Unit;
use crate::physics::groups::{Groups, dimensionless_energy};
use crate::physics::parameter::{Parameter, ParameterError};
use crate::physics::semi_empirical::{eq15_printed, eq15_unrounded};
use crate::physics::{Advice, CraterStiffness, Criterion, Outcome, Range, Resistance, Scene, Shown};

/// Most points of one sweep: a table of a gigabyte.
pub const POINTS_MAX: usize = 10_000_000;

/// Values along one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Axis {
    /// Path of the number that is varied.
    #[serde(rename = "path", serialize_with = "as_text")]
    #[cfg_attr(feature = "report", schemars(with = "String"))]
    pub parameter: Parameter,
    /// First value, SI.
    pub from: f64,
    /// Last value, SI.
    pub to: f64,
    /// The unit that both are written in, where the number is a parameter of a law.
    #[serde(skip)]
    pub unit: Option<Unit>,
    /// How many values, both ends among them.
    pub count: usize,
    /// Spaced by ratio in place of difference.
    pub logarithmic: bool,
}

pub(super) fn as_text<S: Serializer>(value: &impl std::fmt::Display, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

/// Why a sweep cannot be made. All are mistakes of the caller, exit code 2.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SweepError {
    /// Not `PATH=A:B:N` or `PATH=A:B:N:log`.
    #[error("`{0}` is not of the form PATH=A:B:N or PATH=A:B:N:log")]
    Form(String),
    /// A parameter or a value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A number of values that no two ends have.
    #[error("`{0}` is no number of values: two or more, or one where both ends are equal")]
    Count(String),
    /// Logarithmic steps through zero.
    #[error("logarithmic steps lead from {} to {} only where both are above zero", Shown(*.from), Shown(*.to))]
    Logarithm {
        /// First value.
        from: f64,
        /// Last value.
        to: f64,
    },
    /// More points than fit.
    #[error("{0} points are too many: at most {POINTS_MAX}")]
    TooMany(usize),
    /// Two axes that set the same number.
    #[error("`{first}` and `{second}` both set `{moved}`", moved = .first.moves())]
    Twice {
        /// One.
        first: Parameter,
        /// The other.
        second: Parameter,
    },
}

impl Advice for SweepError {
    fn help(&self) -> String {
        match self {
            Self::Parameter(error) => error.help(),
            Self::Twice { .. } => "vary one of them".to_owned(),
            Self::TooMany(_) => "take fewer values".to_owned(),
            _ => "write for example H/d=0.5:18:200 or target.strength=20MPa:60MPa:5:log".to_owned(),
        }
    }
}

impl std::str::FromStr for Axis {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let form = || SweepError::Form(text.to_owned());
        let (path, range) = text.split_once('=').ok_or_else(form)?;
        let parameter: Parameter = path.trim().parse()?;
        let parts: Vec<_> = range.split(':').collect();
        let (from, to, count, logarithmic) = match parts[..] {
            [from, to, count] => (from, to, count, false),
            [from, to, count, "log"] => (from, to, count, true),
            _ => return Err(form()),
        };
        let ([from, to], unit) = parameter.parse_ends([from, to])?;
        let bad_count = || SweepError::Count(count.to_owned());
        let count: usize = count.trim().parse().map_err(|_| bad_count())?;
        if count == 0 || (count == 1 && from != to) {
            return Err(bad_count());
        }
        if count > POINTS_MAX {
            return Err(SweepError::TooMany(count));
        }
        if logarithmic && !(from > 0.0 && to > 0.0) {
            return Err(SweepError::Logarithm { from, to });
        }
        Ok(Self { parameter, from, to, unit, count, logarithmic })
    }
}

impl Axis {
    /// Value `index`, from 0 to `count - 1`; the ends are exact.
    pub fn value(&self, index: usize) -> f64 {
        if index == 0 {
            return self.from;
        }
        if index + 1 >= self.count {
            return self.to;
        }
        let share = index as f64 / (self.count - 1) as f64;
        let (ratio, difference) = (self.to / self.from, self.to - self.from);
        match self.logarithmic {
            true if ratio.is_normal() => self.from * ratio.powf(share),
            false if difference.is_finite() => self.from + difference * share,
            // Ends farther apart than a number can say.
            true => (self.from.ln() * (1.0 - share) + self.to.ln() * share).exp(),
            false => self.from * (1.0 - share) + self.to * share,
        }
    }
}

/// One or two axes over a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    scene: Scene,
    written: Written,
    axes: SmallVec<[Axis; 2]>,
}

/// One point of a sweep; `None`, `null` in JSON, where there is no such value.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Row {
    /// Values of the varied parameters, SI, in the order of the axes.
    pub values: Vec<f64>,
    /// How the projectile ended, where the scene has an impact velocity.
    #[cfg_attr(feature = "report", schemars(with = "Option<String>"))]
    pub outcome: Option<Outcome>,
    /// Depth at the end (m).
    pub depth_m: Option<f64>,
    /// Velocity at the end (m/s).
    pub velocity_m_s: Option<f64>,
    /// V_c (m/s), where the target has a far side.
    pub critical_velocity_m_s: Option<f64>,
    /// E_c (J).
    pub critical_energy_j: Option<f64>,
    /// `E_c/(d³ fc)` by the criterion of the scene.
    pub dimensionless_energy: Option<f64>,
    /// Eq. 15 as printed, `E_c/(d³ fc)`.
    pub eq15_printed: Option<f64>,
    /// Eq. 15 unrounded, `E_c/(d³ fc)`.
    pub eq15_unrounded: Option<f64>,
    /// `dimensionless_energy` over `eq15_printed`, less one.
    pub difference_printed: Option<f64>,
    /// `dimensionless_energy` over `eq15_unrounded`, less one.
    pub difference_unrounded: Option<f64>,
    /// `E_c/(d³ fc)` with x = H, along H/d.
    pub energy_full_depth: Option<f64>,
    /// `E_c/(d³ fc)` with x = x_p(H), along H/d.
    pub energy_ndrc: Option<f64>,
    /// H/d.
    #[serde(rename = "H_over_d")]
    pub thickness_ratio: Option<f64>,
    /// Geometry function N; absent without drag.
    #[serde(rename = "N")]
    pub geometry: Option<f64>,
    /// What is proved, with the method `enclosure`.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<Bounds>,
    /// Why the point has no answer, or not all of it. Empty when all is well.
    pub error: String,
}

/// A column of the table behind the varied numbers: its name, its kind, and its cell in a row.
pub type RowColumn = (&'static str, Kind, fn(&Row) -> Value<'_>);

/// The columns of the table behind the varied numbers.
pub const COLUMNS: [RowColumn; 13] = [
    ("outcome", Kind::Text, |row| Value::Text(row.outcome.map_or("", Outcome::name))),
    ("depth_m", Kind::Number, |row| Value::Number(row.depth_m)),
    ("velocity_m_s", Kind::Number, |row| Value::Number(row.velocity_m_s)),
    ("critical_velocity_m_s", Kind::Number, |row| Value::Number(row.critical_velocity_m_s)),
    ("critical_energy_j", Kind::Number, |row| Value::Number(row.critical_energy_j)),
    ("dimensionless_energy", Kind::Number, |row| Value::Number(row.dimensionless_energy)),
    ("eq15_printed", Kind::Number, |row| Value::Number(row.eq15_printed)),
    ("eq15_unrounded", Kind::Number, |row| Value::Number(row.eq15_unrounded)),
    ("error", Kind::Text, |row| Value::Text(&row.error)),
    ("difference_printed", Kind::Number, |row| Value::Number(row.difference_printed)),
    ("difference_unrounded", Kind::Number, |row| Value::Number(row.difference_unrounded)),
    ("energy_full_depth", Kind::Number, |row| Value::Number(row.energy_full_depth)),
    ("energy_ndrc", Kind::Number, |row| Value::Number(row.energy_ndrc)),
];

impl Row {
    /// Its cells in the table: the varied numbers, then [`COLUMNS`], then what is proved.
    pub fn cells(&self) -> Vec<Value<'_>> {
        let values = self.values.iter().map(|value| Value::Number(Some(*value)));
        let proved =
            self.bounds.iter().flat_map(|bounds| enclosure::COLUMNS.map(|(_, cell)| Value::Number(cell(bounds))));
        values.chain(COLUMNS.iter().map(|(.., cell)| cell(self))).chain(proved).collect()
    }

    /// The names and kinds of the columns behind the varied numbers.
    pub fn columns<'a>(is_enclosed: bool) -> impl Iterator<Item = (&'a str, Kind)> {
        let proved = enclosure::COLUMNS.map(|(name, _)| (name, Kind::Number));
        let proved = proved.into_iter().filter(move |_| is_enclosed);
        COLUMNS.map(|(name, kind, _)| (name, kind)).into_iter().chain(proved)
    }
}

impl Plan {
    /// The curves at measured points, H/d and `E_c/(d³ fc)`, computed there and not interpolated.
    ///
    /// # Errors
    /// [`SweepError`]: the scene has no H/d.
    pub fn beside(
        &self,
        points: &[(f64, f64)],
        integrator: &(dyn Integrator + Sync),
    ) -> Result<Vec<MeasuredPoint>, SweepError> {
        let mut data = Vec::with_capacity(points.len());
        for &(thickness_ratio, measured) in points {
            let parameter = Parameter::ThicknessRatio;
            let axis = Axis {
                parameter,
                from: thickness_ratio,
                to: thickness_ratio,
                unit: None,
                count: 1,
                logarithmic: false,
            };
            let there = Self::new(self.scene().clone(), &[axis])?.run(integrator);
            data.extend(there.into_iter().map(|row| {
                let Row { energy_full_depth, energy_ndrc, eq15_printed, .. } = row;
                MeasuredPoint { thickness_ratio, measured, energy_full_depth, energy_ndrc, eq15_printed }
            }));
        }
        Ok(data)
    }

    /// A sweep of `scene` over `axes`.
    ///
    /// # Errors
    /// [`SweepError`]: none or more than two axes, the same number twice, too many points, or a number that the scene
    /// does not have.
    pub fn new(scene: Scene, axes: &[Axis]) -> Result<Self, SweepError> {
        if axes.is_empty() || axes.len() > 2 {
            return Err(SweepError::Form(format!("{} axes", axes.len())));
        }
        if let [first, second] = axes
            && first.parameter.moves() == second.parameter.moves()
        {
            return Err(SweepError::Twice { first: first.parameter, second: second.parameter });
        }
        let points = axes.iter().map(|axis| axis.count).fold(1, usize::saturating_mul);
        if points > POINTS_MAX {
            return Err(SweepError::TooMany(points));
        }
        let mut probe = scene.clone();
        for axis in axes {
            axis.parameter.admit_unit(&probe, axis.unit)?;
            axis.parameter.set(&mut probe, axis.from)?;
        }
        Ok(Self { scene, written: Written::default(), axes: axes.iter().cloned().collect() })
    }

    /// The same sweep, with what was written for the numbers of its scene: for enclosures.
    #[must_use]
    pub fn of_written(self, written: Written) -> Self {
        Self { written, ..self }
    }

    /// The axes.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Paths of the varied numbers.
    pub fn paths(&self) -> Vec<String> {
        self.axes.iter().map(|axis| axis.parameter.to_string()).collect()
    }

    /// The scene before anything is varied.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether it runs along the thickness alone: the sweep of Figures 4 and 5.
    pub fn is_along_thickness(&self) -> bool {
        self.axes.len() == 1 && self.axes[0].parameter.moves() == Parameter::Thickness
    }

    /// How many points; the last axis runs fastest.
    pub fn points(&self) -> usize {
        self.axes.iter().map(|axis| axis.count).product()
    }

    /// Whether S is moved along with the strength by Eq. 14.
    pub fn moves_static_factor(&self) -> bool {
        self.axes.iter().any(|axis| axis.parameter.moves_static_factor(&self.scene))
            && self.axes.iter().all(|axis| axis.parameter != Parameter::StaticFactor)
    }

    /// Which numbers of its scenes are not stated and follow others, one sentence each.
    pub fn follows(&self) -> Vec<String> {
        self.point(0).1.map_or_else(|_| Vec::new(), |scene| scene.follows())
    }

    /// The values and the scene of point `index`.
    ///
    /// # Errors
    /// [`ParameterError`] where the varied numbers take another away.
    pub fn point(&self, index: usize) -> (Vec<f64>, Result<Scene, ParameterError>) {
        let inner = self.axes.last().map_or(1, |axis| axis.count);
        let of_axis = |position: usize| if position + 1 == self.axes.len() { index % inner } else { index / inner };
        let values: Vec<f64> =
            self.axes.iter().enumerate().map(|(position, axis)| axis.value(of_axis(position))).collect();
        let mut order: SmallVec<[(Parameter, f64); 2]> =
            self.axes.iter().map(|axis| axis.parameter).zip(values.iter().copied()).collect();
        // S after the strength, groups after what they are made of.
        order.sort_by_key(|(parameter, _)| *parameter);
        let mut scene = self.scene.clone();
        let set = order.into_iter().try_for_each(|(parameter, value)| parameter.set(&mut scene, value));
        (values, set.map(|()| scene))
    }

    /// Computes every point on all cores. Row `i` depends on no other row, whatever the number of threads.
    ///
    /// A point without an answer has its reason in [`Row::error`] and stops nothing.
    pub fn run(&self, integrator: &(dyn Integrator + Sync)) -> Vec<Row> {
        let row = |index| {
            let reused = integrator.reusing();
            self.row(index, reused.as_deref().unwrap_or(integrator))
        };
        (0..self.points()).into_par_iter().map(row).collect()
    }

    fn row(&self, index: usize, integrator: &dyn Integrator) -> Row {
        let (values, scene) = self.point(index);
        let encloses = integrator.name() == MethodName::Enclosure.name();
        let mut row = Row { values, bounds: encloses.then(Bounds::default), ..Row::default() };
        let filled = scene.map_err(StudyError::from).and_then(|scene| self.fill(&mut row, &scene, integrator));
        row.error = filled.err().map_or_else(String::new, |error| error.to_string());
        row
    }

    /// Solves `scene` where it has an impact velocity, finds V_c where it has a thickness, and compares.
    fn fill(&self, row: &mut Row, scene: &Scene, integrator: &dyn Integrator) -> Studied<()> {
        if let Some(speed) = scene.velocity {
            let flight = integrator.solve(&scene.resolve(speed)?, Detail::End)?;
            row.outcome = Some(flight.outcome);
            (row.depth_m, row.velocity_m_s) = (Some(flight.end.depth), Some(flight.end.velocity));
        }
        let critical = scene.thickness.map(|_| critical_velocity::of_scene(scene, integrator)).transpose();
        if let Ok(Some(found)) = &critical {
            (row.critical_velocity_m_s, row.critical_energy_j) = (Some(found.velocity), Some(found.energy));
        }
        self.compare(scene, integrator, row);
        if let Some(bounds) = &mut row.bounds {
            *bounds = enclosure::bounds(scene, &self.written)?;
        }
        critical?;
        let is_nothing = row.dimensionless_energy == Some(0.0) && row.eq15_unrounded == Some(0.0);
        row.thickness_ratio.filter(|_| is_nothing).map_or(Ok(()), |ratio| Err(StudyError::NoDifference(ratio)))
    }

    /// What a slab of one concrete has beyond its critical velocity: dimensionless energies and Eq. 15.
    fn compare(&self, scene: &Scene, integrator: &dyn Integrator, row: &mut Row) {
        let Some(concrete) = scene.concrete().filter(|concrete| concrete.layers.is_empty()) else { return };
        row.dimensionless_energy = row.critical_energy_j.map(|energy| dimensionless_energy(energy, concrete));
        row.geometry = Groups::of(scene, 0.0).and_then(|groups| groups.geometry);
        let Some(thickness) = scene.thickness else { return };
        let ratio = thickness / concrete.diameter;
        row.thickness_ratio = Some(ratio);
        let finite = |value: f64| value.is_finite().then_some(value);
        row.eq15_printed = finite(concrete.static_factor * eq15_printed(ratio));
        row.eq15_unrounded = finite(concrete.static_factor * eq15_unrounded(ratio));
        let over = |formula: Option<f64>| finite(row.dimensionless_energy? / formula? - 1.0);
        (row.difference_printed, row.difference_unrounded) = (over(row.eq15_printed), over(row.eq15_unrounded));
        if self.is_along_thickness() {
            let by = |criterion: Criterion| {
                if scene.criterion == criterion {
                    return row.dimensionless_energy;
                }
                let other = scene.judged_by(criterion);
                let found = critical_velocity::of_scene(&other, integrator).ok()?;
                Some(dimensionless_energy(found.energy, concrete))
            };
            let (full, ndrc) = (by(Criterion::FullDepth), by(Criterion::Ndrc));
            (row.energy_full_depth, row.energy_ndrc) = (full, ndrc);
        }
    }
}

/// A table of measured points; columns of other names are ignored.
pub static POINTS: Format = Format {
    columns: &[Column::number("H/d").within(Range::Positive), Column::number("E_c/(d3 fc)").within(Range::Positive)],
    others: Others::Ignored,
    has_comments: false,
};

/// Measured points (H/d, `E_c/(d³ fc)`) of the table `bytes`, called `file` in messages.
///
/// # Errors
/// [`TableError`] with line and column.
pub fn read_points(file: &str, bytes: &[u8]) -> Result<Vec<(f64, f64)>, Box<TableError>> {
    tables::read(file, bytes, &POINTS, |row| Ok((row.number(0)?, row.number(1)?)))
}

/// What [`explanation`] explains.
pub const WHY: &str = "Why the simulation lies above Eq. 15";

/// Why the curves along H/d differ, in sentences with the numbers of this sweep; for the terminal and the report.
///
/// Empty for a sweep along anything else.
pub fn explanation(plan: &Plan, rows: &[Row]) -> String {
    if !plan.is_along_thickness() {
        return String::new();
    }
    let over =
        |row: &Row, energy: Option<f64>| Some(100.0 * (energy? / row.eq15_unrounded.filter(|e| *e > 0.0)? - 1.0));
    // The simulation over Eq. 15 (%), where both are known.
    let gaps: Vec<(f64, &Row)> = rows.iter().filter_map(|row| Some((over(row, row.energy_full_depth)?, row))).collect();
    let least = gaps.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last), Some(least)) = (gaps.first(), gaps.last(), least) else { return String::new() };
    let at = |(gap, row): &(f64, &Row)| format!("{gap:+.1} % at H/d = {:.4}", row.thickness_ratio.unwrap_or(f64::NAN));
    let ndrc = rows
        .iter()
        .filter(|row| row.thickness_ratio.is_some_and(|ratio| ratio > 0.0))
        .filter_map(|row| Some(over(row, row.energy_ndrc)?.abs()))
        .fold(0.0, f64::max);
    let parts = |(_, row): &(f64, &Row)| {
        let index = rows.iter().position(|other| std::ptr::eq(other, *row))?;
        parts_of_gap(&plan.point(index).1.ok()?, row)
    };
    let parts: Vec<_> = [first, last].into_iter().filter_map(parts).collect();
    let lowers = parts.iter().any(|(_, drag)| *drag < 0.0);
    let parts = parts.iter().map(|(text, _)| format!(" {text}.")).collect::<Vec<_>>().concat();
    let below = if lowers {
        " Where drag lowers it the crater is what the slab consists of: there drag acts through c alone, and lowers c."
    } else {
        ""
    };
    let values = [
        ("{first}", at(first)),
        ("{last}", at(last)),
        ("{least}", at(least)),
        ("{ndrc}", format!("{ndrc:.1}")),
        ("{parts}", parts),
        ("{below}", below.to_owned()),
    ];
    let text = include_str!("sweep/why.txt").trim_ascii_end();
    values.iter().fold(format!("{WHY}. {text}"), |text, (slot, value)| text.replace(slot, value))
}

/// What the gap between simulation and unrounded Eq. 15 consists of at one point, and the part of drag (%).
///
/// The energy is that of the criterion alone (no drag, k = 2, c continuous), times what k and c make of it, times what
/// drag does.
fn parts_of_gap(scene: &Scene, row: &Row) -> Option<(String, f64)> {
    let energy = |scene: &Scene| {
        let velocity = critical_velocity::exact(&scene.judged_by(Criterion::FullDepth)).ok()?;
        Some(dimensionless_energy(0.5 * scene.mass * velocity * velocity, scene.concrete()?))
    };
    let mut bare = scene.clone();
    let Resistance::Concrete(concrete) = &mut bare.resistance else { return None };
    concrete.density = 0.0;
    let without_drag = energy(&bare)?;
    let Resistance::Concrete(concrete) = &mut bare.resistance else { return None };
    let is_usual = concrete.crater_ratio == 2.0 && concrete.crater_stiffness == CraterStiffness::Continuous;
    (concrete.crater_ratio, concrete.crater_stiffness) = (2.0, CraterStiffness::Continuous);
    let alone = energy(&bare)?;
    let percent = |over: f64, under: f64| 100.0 * (over / under - 1.0);
    let drag = percent(row.energy_full_depth?, without_drag);
    let mut text = format!(
        "At H/d = {:.4} the criterion alone makes {:+.1} %",
        row.thickness_ratio?,
        percent(alone, row.eq15_unrounded?)
    );
    if !is_usual {
        text += &format!(", k and c {:+.1} %", percent(without_drag, alone));
    }
    if let Some(n) = row.geometry {
        text += &format!(", drag (N = {n:.4}) {drag:+.1} %");
    }
    Some((text, if row.geometry.is_some() { drag } else { 0.0 }))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::{Energy, Taylor};
    use crate::testing::shipped;

    fn slab() -> Scene {
        shipped("paper-slab")
    }

    fn plan(axes: &[&str]) -> Plan {
        let axes: Vec<Axis> = axes.iter().map(|text| text.parse().unwrap()).collect();
        Plan::new(slab(), &axes).unwrap()
    }

    #[test]
    fn values_include_both_ends_exactly_and_are_spaced_as_asked() {
        let linear: Axis = "H/d=0.1:18:7".parse().unwrap();
        assert_eq!((linear.value(0), linear.value(6)), (0.1, 18.0));
        assert!((linear.value(1) - linear.value(0) - 17.9 / 6.0).abs() < 1e-14);
        let log: Axis = "target.strength=20MPa:60MPa:3:log".parse().unwrap();
        assert_eq!((log.value(0), log.value(2)), (20e6, 60e6));
        assert!((log.value(1) / (20e6 * 3.0_f64.sqrt()) - 1.0).abs() < 1e-15);
        let wide: Axis = "N=1e-200:1e200:3:log".parse().unwrap();
        assert!((wide.value(1) - 1.0).abs() < 1e-12, "{}", wide.value(1));
        let wide: Axis = "stage.0.static_force=-1.7e308:1.7e308:5".parse().unwrap();
        assert!((wide.value(1) / -0.85e308 - 1.0).abs() < 1e-15 && wide.value(2) == 0.0);
        let falling: Axis = "N=30:10:2".parse().unwrap();
        assert_eq!((falling.value(0), falling.value(1)), (30.0, 10.0));
    }

    #[test]
    fn axes_that_say_nothing_definite_are_refused() {
        for text in ["H/d", "H/d=1:2", "H/d=1:2:3:lin", "H/d=1:2:3:log:4"] {
            assert!(matches!(text.parse::<Axis>(), Err(SweepError::Form(_))), "{text}");
        }
        for text in ["H/d=1:2:1", "H/d=1:2:0", "H/d=1:2:-3", "H/d=1:2:x"] {
            assert!(matches!(text.parse::<Axis>(), Err(SweepError::Count(_))), "{text}");
        }
        assert!(matches!("N=0:2:3:log".parse::<Axis>(), Err(SweepError::Logarithm { .. })));
        for text in ["target.strength=20MPa:60:3", "target.strength=20e6:60 MPa:3"] {
            assert!(
                matches!(text.parse::<Axis>(), Err(SweepError::Parameter(ParameterError::OneUnit { .. }))),
                "{text}"
            );
        }
        for text in ["target.thickness=0:60mm:3", "target.thickness=60 mm:0:3", "target.strength=20e6:60e6:3"] {
            assert!(text.parse::<Axis>().is_ok(), "{text}");
        }
        assert!(matches!("H/d=1:2:99999999999".parse::<Axis>(), Err(SweepError::TooMany(_))));
        let axis = |text: &str| text.parse::<Axis>().unwrap();
        let refused = Plan::new(slab(), &[axis("H/d=1:2:3"), axis("target.thickness=1:2:3")]);
        assert!(matches!(refused, Err(SweepError::Twice { .. })));
        let refused = Plan::new(slab(), &[axis("N=1:2:10000"), axis("I=1:2:10000")]);
        assert!(matches!(refused, Err(SweepError::TooMany(100_000_000))));
    }

    #[test]
    fn a_parameter_of_a_law_is_varied_in_its_own_unit_or_in_si_and_in_no_other() {
        let axis = |text: &str| text.parse::<Axis>().unwrap();
        for text in ["parameters.a=300MPa:500 MPa:3", "parameters.a=3e8:5e8:3", "parameters.a=3e8 kg/(m s^2):500MPa:3"]
        {
            let axis = axis(text);
            assert_eq!((axis.from, axis.to), (3e8, 5e8), "{text}");
            assert!(Plan::new(shipped("law-power"), &[axis]).is_ok(), "{text}");
        }
        let refused = Plan::new(shipped("law-power"), &[axis("parameters.a=300mm:500mm:3")]).map(drop).unwrap_err();
        assert_eq!(refused.to_string(), "`parameters.a` is in Pa, and m is given");
        for text in ["parameters.a=300MPa:500mm:3", "parameters.a=300MPa:5e8:3"] {
            assert!(text.parse::<Axis>().is_err(), "{text}");
        }
    }

    #[test]
    fn small_thickness_keeps_its_digits() {
        let mut scene = slab();
        let Resistance::Concrete(concrete) = &mut scene.resistance else { unreachable!() };
        concrete.density = 0.0;
        scene.criterion = Criterion::Ndrc;
        for exponent in [-3, -6, -9] {
            let ratio = 10f64.powi(exponent);
            Parameter::ThicknessRatio.set(&mut scene, ratio).unwrap();
            let found = critical_velocity::of_scene(&scene, &Taylor::default()).unwrap();
            // y -> (H/d)/3.19 (1 + 0.718 (H/d)/3.19²) as H/d -> 0.
            let y = ratio / 3.19 * (1.0 + 0.718 * ratio / (3.19 * 3.19));
            let expected = 12.0 * std::f64::consts::PI / 16.0 * y * y;
            let error = dimensionless_energy(found.energy, scene.concrete().unwrap()) / expected - 1.0;
            assert!(error.abs() < 2.0 * ratio * ratio + 1e-13, "{ratio}: {error:e}");
        }
    }

    #[test]
    fn simulation_over_eq_15_is_338_percent_at_3_and_50_at_10_and_37_at_18_without_drag() {
        let mut scene = slab();
        let Resistance::Concrete(concrete) = &mut scene.resistance else { unreachable!() };
        concrete.density = 0.0;
        for (ratio, percent) in [(3.0, 338.0), (10.0, 50.1), (18.0, 36.6)] {
            let axis = format!("H/d={ratio}:{ratio}:1").parse().unwrap();
            let rows = Plan::new(scene.clone(), &[axis]).unwrap().run(&Taylor::default());
            let difference = 100.0 * rows[0].difference_printed.unwrap();
            assert!((difference - percent).abs() < 0.5, "{ratio}: {difference}");
            assert!((rows[0].energy_ndrc.unwrap() / rows[0].eq15_unrounded.unwrap() - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn every_point_is_the_scene_that_one_would_write() {
        let plan = plan(&["target.strength=20MPa:60MPa:3", "H/d=2:4:2"]);
        assert!(plan.moves_static_factor());
        let rows = plan.run(&Taylor::default());
        assert_eq!(rows.len(), 6);
        assert_eq!(rows[3].values, [40e6, 4.0]);
        let mut scene = slab();
        Parameter::Strength.set(&mut scene, 40e6).unwrap();
        scene.thickness = Some(4.0 * 0.06);
        assert_eq!(
            rows[3].critical_velocity_m_s.unwrap(),
            critical_velocity::of_scene(&scene, &Taylor::default()).unwrap().velocity
        );
        let exact = critical_velocity::exact(&scene).unwrap();
        assert!((rows[3].critical_velocity_m_s.unwrap() / exact - 1.0).abs() < 1e-13);
    }

    #[test]
    fn order_of_the_axes_does_not_matter_to_a_point() {
        let a = plan(&["projectile.diameter=50mm:70mm:2", "H/d=3:5:2"]).run(&Energy::new());
        let b = plan(&["H/d=3:5:2", "projectile.diameter=50mm:70mm:2"]).run(&Energy::new());
        assert_eq!(a[1].critical_velocity_m_s, b[2].critical_velocity_m_s);
        assert_eq!(a[1].thickness_ratio.map(|r| (r * 1e9).round()), Some(5e9));
    }

    #[test]
    fn a_point_without_an_answer_says_why_and_stops_nothing() {
        let rows = plan(&["projectile.mass=-1:1:3"]).run(&Taylor::default());
        assert!(rows[0].error.contains("mass"), "{}", rows[0].error);
        assert!(rows[1].error.contains("mass"), "{}", rows[1].error);
        assert!(rows[2].error.is_empty() && rows[2].critical_velocity_m_s.is_some());
    }

    #[test]
    fn a_slab_without_thickness_has_its_answer_and_no_difference_in_percent() {
        let rows = plan(&["H/d=0:2:3"]).run(&Taylor::default());
        assert_eq!((rows[0].critical_velocity_m_s, rows[0].dimensionless_energy), (Some(0.0), Some(0.0)));
        assert_eq!((rows[0].eq15_unrounded, rows[0].difference_unrounded), (Some(0.0), None));
        assert!(rows[0].error.contains("no difference from Eq. 15 at H/d = 0"), "{}", rows[0].error);
        assert!(rows[1].error.is_empty() && rows[1].difference_unrounded.is_some());
    }

    #[test]
    fn an_impact_function_moves_the_flight_and_not_the_critical_velocity() {
        let rows = plan(&["I=1:100:5:log"]).run(&Taylor::default());
        assert!(rows.windows(2).all(|pair| pair[0].critical_velocity_m_s == pair[1].critical_velocity_m_s));
        assert_eq!(rows[0].outcome, Some(Outcome::StoppedInCrater));
        assert_eq!(rows[4].outcome, Some(Outcome::Perforated));
    }

    #[test]
    fn measured_points_are_read_by_the_names_of_their_columns() {
        let text = "series,E_c/(d3 fc), H/d\na,10.5,3\n\"b\nc\", 20,5.5\n";
        assert_eq!(read_points("p.csv", text.as_bytes()).unwrap(), [(3.0, 10.5), (5.5, 20.0)]);
    }

    /// Parts of the gap found apart, by mpmath.
    #[test]
    fn the_text_has_the_parts_of_the_gap_of_its_own_scene() {
        let said = |scene: Scene| {
            let plan = Plan::new(scene, &["H/d=0.5:18:2".parse().unwrap()]).unwrap();
            explanation(&plan, &plan.run(&Taylor::default()))
        };
        let text = said(slab());
        for words in [
            "At H/d = 0.5000 the criterion alone makes +844.4 %, drag (N = 38.5802) -3.7 %.",
            "At H/d = 18.0000 the criterion alone makes +36.5 %, drag (N = 38.5802) +44.0 %.",
            "Where drag lowers it",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let mut bare = slab();
        Parameter::Density.set(&mut bare, 0.0).unwrap();
        Parameter::CraterRatio.set(&mut bare, 0.707).unwrap();
        let text = said(bare);
        assert!(text.contains("alone makes +36.5 %, k and c +3.8 %.") && !text.contains("drag ("), "{text}");
        assert!(!text.contains("Where drag lowers it"), "{text}");
    }

    /// mpmath, of the parts above: +80.7 % at H/d = 10.26 is the least, +96.5 % at 18; without drag it falls, to +36.5 %.
    #[test]
    fn the_third_conclusion_is_refuted_by_drag_and_borne_out_without_it() {
        let third = |scene: Scene, points: &[MeasuredPoint]| {
            let plan = Plan::new(scene, &["H/d=0.5:18:200".parse().unwrap()]).unwrap();
            conclusions(&plan.run(&Taylor::default()), points)
        };
        let found = third(slab(), &[]);
        let standing = found.iter().map(|conclusion| conclusion.standing).collect::<Vec<_>>();
        assert_eq!(standing, [Standing::NotTestable, Standing::NotTestable, Standing::Refuted]);
        let reason = &found[2].reason;
        assert!(reason.contains("+80.7 % at H/d = 10.2") && reason.contains("+96.5 % at H/d = 18"), "{reason}");
        // However fine the sweep: from one point to the next the difference rises by next to nothing.
        let fine = Plan::new(slab(), &["H/d=3.5:18:20000".parse().unwrap()]).unwrap();
        assert_eq!(falls(&fine.run(&Taylor::default())).standing, Standing::Refuted);
        let mut bare = slab();
        Parameter::Density.set(&mut bare, 0.0).unwrap();
        let point = |measured| MeasuredPoint {
            thickness_ratio: 5.0,
            measured,
            energy_full_depth: Some(40.0),
            energy_ndrc: Some(19.0),
            eq15_printed: Some(18.5),
        };
        for (points, expected) in [
            (&[point(20.0), point(39.0)][..], [Standing::BorneOut, Standing::BorneOut]),
            (&[point(18.0), point(39.0)], [Standing::Refuted, Standing::BorneOut]),
            (&[point(20.0), point(41.0)], [Standing::BorneOut, Standing::Refuted]),
        ] {
            let found = third(bare.clone(), points);
            assert_eq!(found.iter().map(|c| c.standing).collect::<Vec<_>>()[..2], expected);
            assert_eq!(found[2].standing, Standing::BorneOut, "{}", found[2].reason);
        }
    }

    #[test]
    fn the_text_names_n_and_the_limit_of_the_ratio() {
        let plan = plan(&["H/d=0.5:18:8"]);
        let text = explanation(&plan, &plan.run(&Energy::new()));
        assert!(text.contains("N = 38.58") && text.contains("1.24") && text.contains("x_p"), "{text}");
        let other = self::plan(&["N=10:20:2"]);
        assert_eq!(explanation(&other, &other.run(&Energy::new())), "");
    }
}
