//! Many scenes: what each row of a table asks, and what each is answered (docs/reference.md, "Tables").
//!
//! A row is one crater and one tunnel. Its answer depends on no other row, so threads and neighbours change nothing.
//! Scenes come from a table in chunks ([`Rows`]) or from a seed ([`random_rows`]).

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use thiserror::Error;

use super::critical_velocity::{self, CriticalError};
use super::enclosure::{self, Bounds};
use super::random_scenes::Generator;
use crate::exchange::tables::{
    Block, Column, Columns, Format, Kept, Kind, Need, Others, Place, Row, Rows, TableError, Value,
};
use crate::integrators::lanes::{Batch, Summary};
use crate::integrators::{Detail, IntegrationError, Method, MethodName, Taylor};
use crate::physics::decimals::Written;
use crate::physics::groups::Groups;
use crate::physics::nose::NoseShape;
use crate::physics::parameter::{Absence, Parameter, ParameterError};
use crate::physics::units::Dimension;
use crate::physics::{Concrete, CraterStiffness, Criterion, Outcome, Problem, Resistance, ResolveError, Scene};
use crate::text::{Shown, shortened};

/// A table of scenes; whether its numbers are admissible is for [`Scene::resolve`] to say. Other columns go with their rows.
pub static SCENES: Format = Format { columns: &COLUMNS, others: Others::Kept, has_comments: false };

/// The columns of the first numbers in [`Parameter::PLAIN`], by the names that [`Parameter::column`] gives them.
const NUMBERS: [&str; 11] = [
    "mass_kg",
    "diameter_m",
    "nose_factor",
    "strength_pa",
    "density_kg_m3",
    "thickness_m",
    "S",
    "B",
    "k",
    "crater_stiffness_n_m",
    "velocity_m_s",
];

/// Names of the numbers without their units; those of plain numbers are not asked for.
const STEMS: [&str; NUMBERS.len()] = [
    "mass",
    "diameter",
    "nose_factor",
    "strength",
    "density",
    "thickness",
    "S",
    "B",
    "k",
    "crater_stiffness",
    "velocity",
];

/// Symbols of papers for the numbers, without their units.
const SYMBOLS: [&[&str]; NUMBERS.len()] =
    [&["M"], &["d"], &["N*"], &["fc"], &["rho"], &["H", "H_target"], &[], &[], &[], &[], &["V0", "impact_velocity"]];

/// Index in [`COLUMNS`] of the thickness.
pub(super) const THICKNESS: usize = 5;
/// Index of k.
pub(super) const CRATER_RATIO: usize = 8;
/// Index of the impact velocity.
pub(super) const VELOCITY: usize = 10;
/// Index of the criterion, behind all numbers.
pub(super) const CRITERION: usize = NUMBERS.len();
/// Index of the shape of the nose; the number that goes with it, and the flat of a truncated one, follow.
pub(super) const NOSE: usize = CRITERION + 1;
const NOSE_NUMBER: usize = NOSE + 1;
const TIP: usize = NOSE + 2;
const RESISTANCE: usize = NOSE + 3;

/// The columns of a scene in a table.
pub const COLUMNS: [Column; RESISTANCE + 1] = {
    let mut columns = [Column::text("criterion").needed(Need::Optional); RESISTANCE + 1];
    columns[NOSE] = Column::text("nose").needed(Need::Optional);
    columns[NOSE_NUMBER] = Column::number("CRH").called(&["nose_ratio", "psi"]).needed(Need::Optional);
    columns[TIP] = Column::number("tip_ratio").within(crate::physics::Range::UnitInterval).needed(Need::Optional);
    columns[RESISTANCE] = Column::number("R_pa")
        .measured("R", Dimension::Pressure)
        .within(crate::physics::Range::Positive)
        .needed(Need::Optional);
    let mut index = 0;
    while index < NUMBERS.len() {
        let entry = Parameter::PLAIN[index].entry();
        let column = Column::number(NUMBERS[index]).needed(match entry.absence {
            Absence::Refused(_) => Need::Required,
            Absence::Is(value) => Need::Default(value),
            Absence::Means(_) => Need::Optional,
        });
        columns[index] = match entry.dimension {
            Some(dimension) => column.measured(STEMS[index], dimension),
            None => column,
        }
        .called(SYMBOLS[index]);
        index += 1;
    }
    columns[NOSE_FACTOR].need = Need::Unless("nose");
    columns
};

/// Index of N*.
const NOSE_FACTOR: usize = 2;

/// A scene, of which the rows of a table vary numbers.
#[derive(Debug)]
pub struct Varied {
    scene: Scene,
    parameters: Vec<Parameter>,
    format: &'static Format,
}

impl Varied {
    /// Of `scene`, every number by its path as the name of a column, `parameters.P` or `impact.velocity`; where a cell is
    /// empty or a column is left out, the scene's own.
    ///
    /// Its format is kept as long as the program runs, once for all scenes with the same numbers.
    pub fn new(scene: Scene) -> Self {
        static KNOWN: Mutex<BTreeMap<Vec<Parameter>, &'static Format>> = Mutex::new(BTreeMap::new());
        let mut parameters = Parameter::all_of(&scene);
        for given_by_rows in [Parameter::Velocity, Parameter::Thickness] {
            if !parameters.contains(&given_by_rows) && scene.concrete().is_none_or(|c| c.layers.is_empty()) {
                parameters.push(given_by_rows);
            }
        }
        let column = |parameter: &Parameter| {
            let name: &'static str = Box::leak(parameter.to_string().into_boxed_str());
            Column::number(name).needed(Need::Optional)
        };
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let format = *known.entry(parameters.clone()).or_insert_with(|| {
            let columns: &'static [Column] = Box::leak(parameters.iter().map(column).collect());
            Box::leak(Box::new(Format { columns, others: Others::Kept, has_comments: false }))
        });
        Self { scene, parameters, format }
    }

    /// What a table of its rows may look like.
    pub fn format(&self) -> &'static Format {
        self.format
    }

    fn scene_of(&self, row: &Row<'_>) -> Result<Scene, RowError> {
        let mut scene = self.scene.clone();
        for (index, parameter) in self.parameters.iter().enumerate() {
            if let Some(value) = row.optional(index)? {
                parameter.set(&mut scene, value)?;
            }
        }
        Ok(scene)
    }
}

/// Columns of the results.
pub const RESULT_COLUMNS: [(&str, Kind); 11] = [
    ("row", Kind::Count),
    ("outcome", Kind::Text),
    ("depth_m", Kind::Number),
    ("time_s", Kind::Number),
    ("velocity_m_s", Kind::Number),
    ("crater_end_time_s", Kind::Number),
    ("crater_end_velocity_m_s", Kind::Number),
    ("exit_margin", Kind::Number),
    ("critical_velocity_m_s", Kind::Number),
    ("X_over_d_eq11_12", Kind::Number),
    ("error", Kind::Text),
];

/// Why a column that a table of scenes keeps cannot go with its rows, and what to do.
///
/// The results have one of that name, or it is a number of a scene as the other kind of table names it: `is_varied` where rows
/// vary a scene.
///
/// # Errors
/// Message and help.
pub fn check_kept(kept: &[Kept], is_varied: bool) -> Result<(), (String, String)> {
    let results: Vec<_> = columns(MethodName::Enclosure, true).iter().map(|(name, _)| *name).collect();
    for Kept { name, .. } in kept {
        let refuse =
            |what, help: String| Err((format!("the scenes have a column `{}`, {what}", shortened(name)), help));
        if results.contains(&name.as_str()) {
            return refuse("and so have the results", format!("rename it, say to `given_{name}`"));
        }
        if !is_varied && name.parse::<Parameter>().is_ok() {
            return refuse(
                "the path of a number",
                "name the columns as in docs/reference.md, or give --scene".to_owned(),
            );
        }
        let is_of_scenes = COLUMNS.iter().any(|column| column.name == name || column.may_be_meant(name));
        if is_varied && (name.contains('.') || is_of_scenes) {
            let help = "with --scene columns are paths, such as impact.velocity; rename any other".to_owned();
            return refuse("which is no number of this scene", help);
        }
    }
    Ok(())
}

/// The columns of the results of `method`, with V_c or without.
pub fn columns(method: MethodName, with_critical: bool) -> Vec<(&'static str, Kind)> {
    let count = match (method, with_critical) {
        (MethodName::Enclosure, true) => enclosure::COLUMNS.len(),
        (MethodName::Enclosure, false) => enclosure::COLUMNS.len() - 2,
        _ => 0,
    };
    let enclosed = enclosure::COLUMNS.into_iter().take(count).map(|(name, _)| (name, Kind::Number));
    RESULT_COLUMNS.into_iter().chain(enclosed).collect()
}

/// Rows that are solved together: one block of lanes.
pub const PART: usize = 256;

/// Why a row has no answer.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RowError {
    /// A cell, or the row as a whole.
    #[error(transparent)]
    Table(#[from] Box<TableError>),
    /// A number that the scene does not have.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The scene has no equation of motion.
    #[error(transparent)]
    Scene(#[from] ResolveError),
    /// The integration failed.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
}

/// The words of the column `nose`, each with the number that `CRH` is there.
const NOSES: &str = "not flat, ogive (CRH), cone (CRH is length/diameter), spherical (CRH is radius/diameter), hemispherical, \
                     truncated-ogive or truncated-cone (tip_ratio)";

/// The shape of the nose that `row` names, `None` where it names none. Its number may stand behind the word: `ogive (CRH 3)`.
///
/// # Errors
/// [`TableError`]: an unknown word, a number that is missing, out of its range or there twice.
pub fn nose_of(row: &Row<'_>) -> Result<Option<NoseShape>, Box<TableError>> {
    let text = row.text(NOSE)?;
    if text.is_empty() {
        return Ok(None);
    }
    let (word, behind) = text.split_once('(').map_or((text, None), |(word, rest)| (word, Some(rest)));
    let word: String = word.chars().filter(|c| c.is_alphabetic()).flat_map(char::to_lowercase).collect();
    let behind = match behind.map(|rest| rest.trim_end_matches(')').trim_start_matches(|c: char| !c.is_ascii_digit())) {
        None => None,
        Some(number) => match number.trim().parse::<f64>() {
            Ok(number) if row.optional(NOSE_NUMBER)?.is_none_or(|other| other == number) => Some(number),
            _ => return Err(row.refuse_cell(NOSE, text, "not a nose with one number")),
        },
    };
    let given = || behind.map_or_else(|| row.number(NOSE_NUMBER), Ok);
    let at_least = |least: f64, includes: bool| {
        let number = given()?;
        if number >= least && (includes || number > least) && number.is_finite() {
            return Ok(number);
        }
        let reason = format!("not a number {} {least}", if includes { ">=" } else { ">" });
        Err(row.refuse_cell(NOSE_NUMBER, &Shown(number).to_string(), reason))
    };
    let half = || at_least(0.5, true);
    Ok(Some(match word.as_str() {
        "flat" | "flatassumed" => NoseShape::Flat,
        "ogive" | "ogival" => NoseShape::Ogive { caliber_radius_head: half()? },
        "cone" | "conical" => NoseShape::Cone { length_ratio: at_least(0.0, false)? },
        "spherical" => NoseShape::Spherical { radius_ratio: half()? },
        "hemispherical" | "hemisphere" if behind.is_none_or(|number| number == 0.5) => {
            NoseShape::Spherical { radius_ratio: 0.5 }
        }
        "truncatedogive" => NoseShape::TruncatedOgive { caliber_radius_head: half()?, tip_ratio: row.number(TIP)? },
        "truncatedcone" => {
            NoseShape::TruncatedCone { length_ratio: at_least(0.0, false)?, tip_ratio: row.number(TIP)? }
        }
        _ => return Err(row.refuse_cell(NOSE, text, NOSES)),
    }))
}

/// The scene of `row`; S follows the strength where the row gives neither S nor R = S fc.
///
/// # Errors
/// [`RowError`]: a cell that cannot be read or is missing, or a strength that gives no S.
pub fn scene_of(row: &Row<'_>) -> Result<Scene, RowError> {
    let shape = nose_of(row)?;
    Ok(Scene { velocity: Some(row.number(VELOCITY)?), ..scene_with(row, shape, row.number(CRATER_RATIO)?)? })
}

/// As [`scene_of`] with a nose of `shape`, unless the row gives N*, and k = `crater_ratio`; without a velocity where it has none.
///
/// # Errors
/// [`RowError`].
pub fn scene_with(row: &Row<'_>, shape: Option<NoseShape>, crater_ratio: f64) -> Result<Scene, RowError> {
    let strength = row.number(3)?;
    let static_factor = match (row.optional(6)?, row.optional(RESISTANCE)?) {
        (Some(_), Some(_)) => {
            return Err(row.refuse_cell(RESISTANCE, row.text(RESISTANCE)?, "there beside S, and R = S fc").into());
        }
        (factor, resistance) => factor.or(resistance.map(|resistance| resistance / strength)),
    };
    let nose_factor = row.optional(NOSE_FACTOR)?.or(shape.map(NoseShape::factor));
    Ok(Scene {
        title: None,
        mass: row.number(0)?,
        forces: Vec::new(),
        ends: Vec::new(),
        plug: None,
        parameters: Vec::new(),
        resistance: Resistance::Concrete(Concrete {
            diameter: row.number(1)?,
            nose_factor: nose_factor.ok_or_else(|| row.refuse_empty(NOSE_FACTOR))?,
            strength,
            density: row.number(4)?,
            static_factor: static_factor.map_or_else(|| Concrete::usual_static_factor(strength), Ok)?,
            follows_eq14: static_factor.is_none(),
            inertia_factor: row.number(7)?,
            crater_ratio,
            crater_stiffness: row.optional(9)?.map_or(CraterStiffness::Continuous, CraterStiffness::Given),
            layers: Vec::new(),
        }),
        thickness: row.optional(THICKNESS)?,
        criterion: match row.text(CRITERION)? {
            "" => Criterion::default(),
            name => match name.parse() {
                Ok(criterion) if criterion != Criterion::Plug => criterion,
                _ => return Err(row.refuse_cell(CRITERION, name, "not full-depth or ndrc").into()),
            },
        },
        velocity: row.optional(VELOCITY)?,
    })
}

/// The cells of `scene`, a crater and a tunnel, in the order of [`SCENES`]: [`scene_of`] gives it back.
pub fn cells_of(scene: &Scene) -> Vec<Value<'static>> {
    let criterion = Value::Text(if scene.criterion == Criterion::Ndrc { "ndrc" } else { "" });
    // An S that is not stated stays so.
    let follows = scene.concrete().is_some_and(|concrete| concrete.follows_eq14);
    let is_stated = |parameter: &Parameter| !(follows && *parameter == Parameter::StaticFactor);
    let value = |parameter: &Parameter| parameter.get(scene).ok().filter(|_| is_stated(parameter));
    let numbers = Parameter::PLAIN.iter().take(NUMBERS.len()).map(|parameter| Value::Number(value(parameter)));
    // The nose has its N*, and R its S.
    let rest = [Value::Text(""), Value::Number(None), Value::Number(None), Value::Number(None)];
    numbers.chain([criterion]).chain(rest).collect()
}

/// Scenes, some thousands of them.
#[derive(Debug)]
pub enum Scenes {
    /// Rows of a table.
    Table(Rows),
    /// Rows of a table that vary a scene.
    Varied(Rows, Arc<Varied>),
    /// Random scenes of a seed, by their numbers from 0; the first is a multiple of [`PART`].
    Random {
        /// Seed.
        seed: u64,
        /// Which scenes.
        rows: Range<u64>,
    },
}

impl Scenes {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Table(rows) | Self::Varied(rows, _) => rows.len(),
            Self::Random { rows, .. } => (rows.end - rows.start) as usize,
        }
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The scenes of `part`, which begins at a multiple of [`PART`] and is no longer than that.
    pub fn scenes(&self, part: Range<usize>) -> Vec<Result<Scene, RowError>> {
        match self {
            Self::Table(rows) => part.map(|index| scene_of(&whole(rows, index)?)).collect(),
            Self::Varied(rows, of) => part.map(|index| of.scene_of(&whole(rows, index)?)).collect(),
            Self::Random { seed, rows } => {
                let first = rows.start + part.start as u64;
                random_rows(*seed, first / PART as u64).take(part.len()).map(Ok).collect()
            }
        }
    }

    /// Columns that go with the scenes.
    pub fn kept(&self) -> &[Kept] {
        match self {
            Self::Table(rows) | Self::Varied(rows, _) => rows.layout().kept(),
            Self::Random { .. } => &[],
        }
    }

    /// The cells of scene `index` in the columns that go with it; empty ones of a row that cannot be read.
    fn kept_cells(&self, index: usize) -> Vec<Value<'_>> {
        let empty = |kept: &Kept| if kept.kind == Kind::Text { Value::Text("") } else { Value::Number(None) };
        match self {
            Self::Table(rows) | Self::Varied(rows, _) => match rows.row(index) {
                Ok(row) => row.kept().collect(),
                Err(_) => self.kept().iter().map(empty).collect(),
            },
            Self::Random { .. } => Vec::new(),
        }
    }

    /// The message of `answer` to scene `index`, with its place in the table; empty where nothing is missing.
    fn message(&self, index: usize, answer: &Result<Answer, RowError>) -> String {
        let cause = match answer {
            Ok(Answer { critical: Some(Err(error)), .. }) => error.to_string(),
            Ok(_) => return String::new(),
            Err(RowError::Table(error)) => return error.to_string(),
            Err(error) => error.to_string(),
        };
        match self {
            Self::Table(rows) | Self::Varied(rows, _) => {
                format!("{}: {cause}", Place { at: rows.at(index), ..Place::default() })
            }
            Self::Random { .. } => cause,
        }
    }

    /// The rows of results of `answers`, which begin with scene `from`; their numbers in the table begin with `first`.
    pub fn results(
        &self,
        from: usize,
        first: u64,
        answers: &[Result<Answer, RowError>],
        columns: &Columns<'_>,
        is_parquet: bool,
    ) -> Block {
        let kept = self.kept().len();
        let mut block = Block::empty(columns, is_parquet);
        if let Block::Lines(lines) = &mut block {
            lines.reserve(160 * answers.len());
        }
        for ((index, row), answer) in (from..).zip(first..).zip(answers) {
            let message = self.message(index, answer);
            let (outcome, numbers) = match answer {
                Ok(answer) => (answer.solution.outcome.name(), answer.numbers()),
                Err(_) => ("", [None; 8]),
            };
            let [a, b, c, d, e, f, g, h] = numbers.map(Value::Number);
            let cells = [Value::Count(row), Value::Text(outcome), a, b, c, d, e, f, g, h, Value::Text(&message)];
            let enclosed = columns.len() - cells.len() - kept;
            if enclosed + kept == 0 {
                block.push(&cells);
            } else {
                let kept = self.kept_cells(index);
                let bounds = answer.as_ref().ok().and_then(|answer| answer.bounds).unwrap_or_default();
                let proved = enclosure::COLUMNS.iter().take(enclosed).map(|(_, cell)| Value::Number(cell(&bounds)));
                block.push(&cells.iter().copied().chain(proved).chain(kept).collect::<Vec<_>>());
            }
        }
        block
    }
}

/// Row `index`; one with a cell that goes with it and is no text is refused like any other.
fn whole(rows: &Rows, index: usize) -> Result<Row<'_>, Box<TableError>> {
    let row = rows.row(index)?;
    if !rows.layout().kept().is_empty() {
        row.check_text()?;
    }
    Ok(row)
}

/// The columns of the results of `method` with those `kept` of the scenes behind them.
pub fn columns_with(method: MethodName, with_critical: bool, kept: &[Kept]) -> Vec<(&str, Kind)> {
    let kept = kept.iter().map(|kept| (kept.name.as_str(), kept.kind));
    columns(method, with_critical).into_iter().chain(kept).collect()
}

/// The scenes of part `part` of the endless random table with `seed`; a part has [`PART`] rows.
pub fn random_rows(seed: u64, part: u64) -> impl Iterator<Item = Scene> {
    let mut generator = Generator::new(seed, &format!("batch {part}"));
    std::iter::repeat_with(move || generator.next_scene()).take(PART)
}

/// What a row is answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The solution.
    pub solution: Summary,
    /// Critical velocity (m/s), where it was asked for and the target has a thickness, or why there is none.
    pub critical: Option<Result<f64, Box<CriticalError>>>,
    /// Depth X/d of Eq. 11-12 without a far side; `None` for stages and layers.
    pub depth_ratio_eq11_12: Option<f64>,
    /// True if a fixed step stayed within its stability limit, and for every other method.
    pub stable: bool,
    /// True if S is left to Eq. 14 outside the experiments to which it was fitted.
    pub outside_eq14: bool,
    /// What is proved, with the method `enclosure`.
    pub bounds: Option<Bounds>,
}

impl Answer {
    /// Its numbers, in the order of [`RESULT_COLUMNS`].
    fn numbers(&self) -> [Option<f64>; 8] {
        let Summary { end, crater_end, exit_margin, .. } = self.solution;
        [
            Some(end.depth),
            Some(end.time),
            Some(end.velocity),
            crater_end.map(|s| s.time),
            crater_end.map(|s| s.velocity),
            exit_margin,
            self.critical.as_ref().and_then(|critical| critical.as_ref().ok()).copied(),
            self.depth_ratio_eq11_12,
        ]
    }
}

/// Solves `scenes` by `method`, and finds the critical velocity of those with a thickness if `with_critical`.
///
/// The default Taylor method works in lanes ([`Batch`]), any other row by row. An error says what is wrong with the
/// row, or what could not be computed; it stops no other row.
pub fn answers(
    scenes: Vec<Result<Scene, RowError>>,
    method: &Method,
    with_critical: bool,
) -> Vec<Result<Answer, RowError>> {
    let mut problems: Vec<Problem> = Vec::with_capacity(scenes.len());
    // Why a scene has no problem; scenes are large and stay where they are.
    let mut causes: Vec<Option<ResolveError>> = Vec::with_capacity(scenes.len());
    let mut before: Option<&Scene> = None;
    for scene in &scenes {
        let Ok(scene) = scene else {
            causes.push(None);
            continue;
        };
        // Rows that vary the speed alone share the laws of the first of them.
        let shared = before.filter(|before| scene.has_laws_of(before)).and(problems.last());
        let problem = match (shared, scene.velocity) {
            (Some(problem), Some(speed)) => scene.resolve_from(problem, speed),
            _ => scene.problem(),
        };
        causes.push(problem.map(|problem| problems.push(problem)).err());
        before = causes.last().is_some_and(Option::is_none).then_some(scene);
    }
    let answer = |solution, stable| Answer {
        solution,
        critical: None,
        depth_ratio_eq11_12: None,
        stable,
        outside_eq14: false,
        bounds: None,
    };
    let solved: Vec<Result<Answer, IntegrationError>> = if method.is_plain(MethodName::Taylor) {
        Batch::new().solve(&problems).into_iter().map(|solution| Ok(answer(solution?, true))).collect()
    } else if method.name() == MethodName::Enclosure {
        let solvable = scenes.iter().zip(&causes).filter(|(_, cause)| cause.is_none());
        solvable.filter_map(|(scene, _)| Some(enclosed(scene.as_ref().ok()?, with_critical))).collect()
    } else {
        let reused = method.integrator().reusing();
        let integrator = reused.as_deref().unwrap_or(method.integrator());
        let solve = |problem: &Problem| {
            let flight = integrator.solve(problem, Detail::Events)?;
            Ok(answer(Summary::from(&flight), flight.step_limit.is_none_or(|limit| limit.stable)))
        };
        problems.iter().map(solve).collect()
    };
    let mut solved = solved.into_iter();
    let answers = scenes.into_iter().zip(causes).map(|(scene, cause)| {
        let scene = scene?;
        cause.map_or(Ok(()), Err)?;
        let Some(answer) = solved.next() else { unreachable!("one solution a problem, and one problem a scene") };
        let mut answer = answer?;
        let groups = scene.velocity.and_then(|speed| Groups::of(&scene, speed));
        answer.depth_ratio_eq11_12 = groups.map(|groups| groups.depth_ratio_eq11_12);
        answer.outside_eq14 = scene.concrete().zip(scene.velocity).is_some_and(|(concrete, speed)| {
            concrete.follows_eq14 && concrete.layers.is_empty() && !concrete.use_of_eq14(speed).is_in_range()
        });
        if with_critical && scene.thickness.is_some() && answer.critical.is_none() {
            let critical = critical_velocity::of_scene(&scene, method.integrator());
            answer.critical = Some(critical.map(|critical| critical.velocity).map_err(Box::new));
        }
        Ok(answer)
    });
    answers.collect()
}

/// The flight of `scene` between two numbers, and its V_c if `with_critical`.
fn enclosed(scene: &Scene, with_critical: bool) -> Result<Answer, IntegrationError> {
    // Its numbers count as the shortest decimals of what was read.
    let written = Written::default();
    let out_of_range = |error: ResolveError| IntegrationError::Refused { method: "enclosure", why: error.to_string() };
    let flight = enclosure::flight(scene, &written, Detail::Events).map_err(out_of_range)??;
    let mut answer = Answer {
        solution: Summary::from(&flight.values()),
        critical: None,
        depth_ratio_eq11_12: None,
        stable: true,
        outside_eq14: false,
        bounds: None,
    };
    let mut bounds = Bounds::default().with_end(&flight.end);
    if with_critical && scene.thickness.is_some() {
        let found = critical_velocity::of_scene(scene, &Taylor::default());
        let proved = found.as_ref().ok().and_then(|found| enclosure::between(scene, &written, found.velocity));
        answer.critical = Some(match (found, proved) {
            (Ok(_), Some((low, high))) => {
                bounds = bounds.with_critical(proved);
                Ok(low + 0.5 * (high - low))
            }
            (Ok(found), None) => {
                let remedy = "no proof was found; take --method taylor";
                Err(CriticalError::Undecided { velocity: found.velocity, error_bar: f64::INFINITY, remedy }.into())
            }
            (Err(error), _) => Err(error.into()),
        });
    }
    answer.bounds = Some(bounds);
    Ok(answer)
}

/// Results of `scenes`, part by part on all threads of the pool at hand, and how many came to what; `first` is the number of
/// the first row, from 1.
pub fn solve(scenes: &Scenes, first: u64, method: &Method, critical: bool, is_parquet: bool) -> (Tally, Vec<Block>) {
    let total = scenes.len();
    let columns = &columns_with(method.name(), critical, scenes.kept());
    let (tallies, blocks): (Vec<Tally>, Vec<Block>) = (0..total.div_ceil(PART))
        .into_par_iter()
        // Single parts: a thread that takes several at once keeps the others waiting at the end of the chunk.
        .with_max_len(1)
        .map(|index| {
            let from = index * PART;
            let answers = answers(scenes.scenes(from..total.min(from + PART)), method, critical);
            (Tally::of(&answers), scenes.results(from, first + from as u64, &answers, columns, is_parquet))
        })
        .unzip();
    let mut tally = Tally::default();
    for counted in tallies {
        tally += counted;
    }
    (tally, blocks)
}

/// How many rows came to what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// All rows.
    pub rows: u64,
    /// Without a solution, or without the critical velocity that was asked for.
    pub bad: u64,
    /// With the outcome or the critical velocity undecided.
    pub undecided: u64,
    /// Solved with a step beyond the stability limit of the scheme.
    pub unstable: u64,
    /// Solved with an S of Eq. 14 outside the experiments to which it was fitted.
    pub outside_eq14: u64,
}

impl Tally {
    /// Counts `answers`.
    pub fn of(answers: &[Result<Answer, RowError>]) -> Self {
        let mut tally = Self { rows: answers.len() as u64, ..Self::default() };
        for answer in answers {
            let Ok(answer) = answer else {
                tally.bad += 1;
                continue;
            };
            tally.unstable += u64::from(!answer.stable);
            tally.outside_eq14 += u64::from(answer.outside_eq14);
            match &answer.critical {
                Some(Err(error)) if !matches!(**error, CriticalError::Undecided { .. }) => tally.bad += 1,
                critical => {
                    let has_gap = matches!(critical, Some(Err(_)));
                    tally.undecided += u64::from(has_gap || answer.solution.outcome == Outcome::Undecided);
                }
            }
        }
        tally
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.rows += other.rows;
        self.bad += other.bad;
        self.undecided += other.undecided;
        self.unstable += other.unstable;
        self.outside_eq14 += other.outside_eq14;
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;
    use crate::exchange::tables::CsvTable;
    use crate::integrators::MethodOptions;

    fn taylor() -> Method {
        Method::new(MethodName::Taylor, &MethodOptions::default()).unwrap()
    }

    /// Scenes with these cells below the names of the columns up to the criterion.
    fn table(lines: &str) -> Scenes {
        let names = COLUMNS[..=CRITERION].iter().map(|column| column.name).collect::<Vec<_>>().join(",");
        let text = format!("{names}\n{lines}");
        let mut table = CsvTable::new("t.csv", text.as_bytes(), &SCENES).unwrap();
        Scenes::Table(table.next_rows(100, None).unwrap())
    }

    #[test]
    fn rows_vary_the_numbers_of_a_scene_by_their_paths() {
        let text = "projectile.mass = 2\nparameters.P = '1 kN'\n[[stage]]\nforce = 'P'\nend = 1\n[[stage]]\nstatic_force = 10\n";
        let varied = Arc::new(Varied::new(Scene::from_toml(text, "law").unwrap()));
        let rows = "parameters.P,impact.velocity,target.thickness,stage.1.static_force\n2e3,10,,\n,20,0.5,7\n,,,\n";
        let mut table = CsvTable::new("t.csv", rows.as_bytes(), varied.format()).unwrap();
        let scenes = Scenes::Varied(table.next_rows(100, None).unwrap(), varied);
        let answers = answers(scenes.scenes(0..3), &taylor(), false);
        // X = M V0²/(2 P); W = V0² - 2 P H/M; no speed.
        let end = |index: usize| answers[index].as_ref().unwrap().solution.end;
        assert!((end(0).depth - 0.05).abs() < 1e-16, "{}", end(0));
        assert_eq!((end(1).depth, end(1).velocity), (0.4, 0.0));
        assert_eq!(answers[2], Err(RowError::Scene(ResolveError::NoImpactSpeed)));
        let table = CsvTable::new("t.csv", "parameters.Q\n1\n".as_bytes(), scenes_format()).unwrap();
        let (error, _) = check_kept(table.layout().kept(), true).unwrap_err();
        assert!(error.contains("parameters.Q"), "{error}");
    }

    fn scenes_format() -> &'static Format {
        Varied::new(crate::testing::scene()).format()
    }

    #[test]
    fn a_factor_that_a_row_states_is_stated() {
        let scenes = table("2,0.05,0.72,36e6,2300,,12,,,,300,\n2,0.05,0.72,36e6,2300,,,,,,300,\n").scenes(0..2);
        let follows: Vec<_> =
            scenes.iter().map(|scene| scene.as_ref().unwrap().concrete().unwrap().follows_eq14).collect();
        assert_eq!(follows, [false, true]);
    }

    #[test]
    fn defaults_fill_what_a_row_leaves_empty() {
        let scenes = table("2,0.05,0.72,36e6,2300,,,,,,300,\n");
        let scene = scenes.scenes(0..1).remove(0).unwrap();
        let concrete = scene.concrete().unwrap();
        // Eq. 14: 72/sqrt(36).
        assert_eq!((concrete.static_factor, concrete.inertia_factor, concrete.crater_ratio), (12.0, 1.0, 2.0));
        let answer = answers(vec![Ok(scene)], &taylor(), true).remove(0).unwrap();
        assert!((answer.solution.end.depth - 0.144_826_200_112_217_07).abs() < 1e-15);
        assert_eq!(answer.critical, None);
    }

    #[test]
    fn a_row_without_an_answer_has_one_quoted_cell_that_names_its_line() {
        // S would follow from the strength: no scene with a NaN.
        let scenes =
            table("2,0.05,0.72,-36e6,2300,,,,,,300,\n2,0.05,0.72,36e6,2300,,,,,,300,\"a \"\"b\"\"\u{202e}\"\n");
        let found = answers(scenes.scenes(0..2), &taylor(), false);
        let lines = [
            "7,,,,,,,,,,\"line 2: the strength fc [Pa] = -36000000 is not admissible: it must be a number > 0\"\n",
            "8,,,,,,,,,,\"line 3, column 12: `a \"\"b\"\"\u{fffd}` in `criterion` is not full-depth or ndrc\"\n",
        ];
        let Block::Lines(text) = scenes.results(0, 7, &found, &RESULT_COLUMNS, false) else { unreachable!("not CSV") };
        assert_eq!(text, lines.concat());
        assert_eq!((Tally::of(&found).rows, Tally::of(&found).bad), (2, 2));
    }

    #[test]
    fn a_random_table_is_the_same_however_it_is_cut() {
        let whole = Scenes::Random { seed: 3, rows: 0..4096 };
        let later = Scenes::Random { seed: 3, rows: 2048..4096 };
        assert_eq!(whole.scenes(2048..3072), later.scenes(0..1024));
        assert_ne!(whole.scenes(0..10), whole.scenes(1024..1034));
    }
}
