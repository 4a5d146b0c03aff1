//! Many scenes from a table: what each row asks, and what each is answered (contract, "Tables").
//!
//! A row is one crater and one tunnel. Its result depends on no other row, so that threads and neighbours change
//! nothing. Tables come as CSV ([`csv`]), as Parquet (feature `parquet`) or from a seed ([`random_rows`]); all are read
//! in chunks, and each turns its rows into scenes one by one.

pub mod csv;

use std::borrow::Cow;
use std::fmt::Write as _;
use std::ops::Range;

use thiserror::Error;

use super::audit::Place;
use super::columns::{Cells, Kind};
use super::critical_velocity::{self, CriticalError};
use super::random_scenes::Generator;
use super::table_text::{shortened, steers};
use crate::integrators::batch::{Batch, Summary};
use crate::integrators::{Detail, IntegrationError, Method, Taylor, keeping};
use crate::physics::{Concrete, CraterStiffness, Criterion, Outcome, Problem, Resistance, Scene};

/// Columns that a table may have, in the order of the contract.
pub const COLUMNS: [&str; 12] = [
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
    "criterion",
];

/// How many of [`COLUMNS`] are numbers: all but the last.
pub const NUMBERS: usize = COLUMNS.len() - 1;

/// Index of the column of text.
pub const CRITERION: usize = NUMBERS;

/// Columns that may be left out, or left empty in a row.
const OPTIONAL: [&str; 6] = ["thickness_m", "S", "B", "k", "crater_stiffness_n_m", "criterion"];

/// Columns of the results.
pub const RESULT_COLUMNS: [(&str, Kind); 10] = [
    ("row", Kind::Count),
    ("outcome", Kind::Text),
    ("depth_m", Kind::Number),
    ("time_s", Kind::Number),
    ("velocity_m_s", Kind::Number),
    ("crater_end_time_s", Kind::Number),
    ("crater_end_velocity_m_s", Kind::Number),
    ("exit_margin", Kind::Number),
    ("critical_velocity_m_s", Kind::Number),
    ("error", Kind::Text),
];

/// How many of [`RESULT_COLUMNS`] are numbers: all but the first two and the last.
const RESULT_NUMBERS: usize = RESULT_COLUMNS.len() - 3;

/// Rows that are worked on together: one block of lanes.
pub const PART: usize = 256;

/// Why a table cannot be used at all (exit code 2).
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TableError {
    /// It cannot be read.
    #[error("{file}: {cause}")]
    Unreadable {
        /// File.
        file: String,
        /// What the system said.
        cause: String,
    },
    /// No line at all.
    #[error("{file}: the table is empty: its first line must name the columns")]
    Empty {
        /// File.
        file: String,
    },
    /// The first line is not text.
    #[error("{place}: the first line is not text in UTF-8")]
    NotText {
        /// Where.
        place: Place,
    },
    /// The first line holds numbers.
    #[error("{place}: the first line must name the columns, and this one holds numbers")]
    NoHeader {
        /// Where.
        place: Place,
    },
    /// A name that is no column.
    #[error("{place}: there is no column `{name}`{}", .near.map_or(String::new(), |n| format!("; is `{n}` meant?")))]
    UnknownColumn {
        /// Where.
        place: Place,
        /// Name found.
        name: String,
        /// The name that it resembles.
        near: Option<&'static str>,
    },
    /// A column twice.
    #[error("{place}: the column `{name}` is there twice")]
    ColumnTwice {
        /// Where.
        place: Place,
        /// Name.
        name: String,
    },
    /// A column that every scene needs.
    #[error("{place}: the column `{name}` is missing")]
    MissingColumn {
        /// Where.
        place: Place,
        /// Its name.
        name: &'static str,
    },
    /// A column of the wrong type.
    #[error("{file}: the column `{name}` holds {found}, not {expected}")]
    WrongType {
        /// File.
        file: String,
        /// Column.
        name: String,
        /// Type found.
        found: String,
        /// Type needed.
        expected: &'static str,
    },
    /// A compression that cannot be undone here.
    #[error("{file}: compressed by {name}, which this program does not read")]
    Compressed {
        /// File.
        file: String,
        /// Name of the compression.
        name: String,
    },
    /// A line beyond every reason.
    #[error("{place}: this line has no end within 1 MiB: it is no table, or a quote is not closed")]
    LineTooLong {
        /// Where.
        place: Place,
    },
    /// A quote that is not closed in its line, and so swallows the lines behind it.
    #[error("{place}: a quote is opened and not closed in this line")]
    OpenQuote {
        /// Where.
        place: Place,
    },
}

impl TableError {
    /// Help for a person: what to change.
    pub fn help(&self) -> String {
        match self {
            Self::Unreadable { .. } => "name a table of scenes (.csv), or - for standard input".to_owned(),
            Self::Compressed { .. } => "write the table without compression, or with Snappy".to_owned(),
            Self::UnknownColumn { name, .. } if name.contains([';', char::REPLACEMENT_CHARACTER]) => {
                "separate the cells by commas, and write decimals with a point".to_owned()
            }
            Self::NotText { .. } => "save the table as CSV in UTF-8".to_owned(),
            Self::OpenQuote { .. } | Self::LineTooLong { .. } => "close the quote, or remove it".to_owned(),
            Self::WrongType { .. } => {
                "store numbers as DOUBLE, FLOAT or integers, and the criterion as text".to_owned()
            }
            _ => format!("columns: {}; the others may be left out: {}", needed_columns(), OPTIONAL.join(", ")),
        }
    }
}

fn needed_columns() -> String {
    let needed: Vec<_> = COLUMNS.into_iter().filter(|name| !OPTIONAL.contains(name)).collect();
    needed.join(", ")
}

/// Where each column of [`COLUMNS`] stands in the table at hand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Index of each column, from 0.
    pub places: [Option<usize>; COLUMNS.len()],
    /// Number of columns.
    pub width: usize,
}

impl Layout {
    /// The layout that the names of the columns describe; `place` says where column `n` (from 1) is named.
    ///
    /// # Errors
    /// [`TableError`]: an unknown, doubled or missing column, or numbers in place of names.
    pub fn new<'a>(
        names: impl IntoIterator<Item = &'a str>,
        place: impl Fn(usize) -> Place,
    ) -> Result<Self, TableError> {
        let mut places = [None; COLUMNS.len()];
        let mut width = 0;
        for name in names {
            let name = name.trim();
            width += 1;
            if name.parse::<f64>().is_ok() {
                return Err(TableError::NoHeader { place: place(width) });
            }
            let Some(index) = COLUMNS.iter().position(|known| *known == name) else {
                let is_word = name.chars().all(|c| c.is_alphanumeric() || "_ ()/".contains(c));
                let near = COLUMNS
                    .into_iter()
                    .filter(|_| is_word)
                    .map(|known| (strsim::jaro_winkler(&known.to_lowercase(), &name.to_lowercase()), known))
                    .filter(|(similarity, _)| *similarity > 0.8)
                    .max_by(|a, b| a.0.total_cmp(&b.0));
                let near = near.map(|(_, known)| known);
                return Err(TableError::UnknownColumn { place: place(width), name: shortened(name), near });
            };
            if places[index].replace(width - 1).is_some() {
                return Err(TableError::ColumnTwice { place: place(width), name: name.to_owned() });
            }
        }
        for (index, name) in COLUMNS.into_iter().enumerate() {
            if places[index].is_none() && !OPTIONAL.contains(&name) {
                return Err(TableError::MissingColumn { place: place(0), name });
            }
        }
        Ok(Self { places, width })
    }
}

/// The cells of a row; empty ones are `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row<'a> {
    /// The numbers, in the order of [`COLUMNS`].
    pub numbers: [Option<f64>; NUMBERS],
    /// The criterion.
    pub criterion: Option<&'a str>,
}

impl Row<'_> {
    /// The scene of the row, S by its strength where it gives none; whether its other numbers are admissible is for
    /// [`Scene::resolve`] to say.
    ///
    /// # Errors
    /// What is wrong, with the column.
    pub fn scene(&self) -> Result<Scene, String> {
        let needed = |index: usize| {
            self.numbers[index].ok_or_else(|| format!("{}: empty, and every scene needs it", COLUMNS[index]))
        };
        let strength = needed(3)?;
        let static_factor = match self.numbers[6] {
            Some(given) => given,
            None => Concrete::usual_static_factor(strength).map_err(|error| error.to_string())?,
        };
        Ok(Scene {
            title: None,
            mass: needed(0)?,
            resistance: Resistance::Concrete(Concrete {
                diameter: needed(1)?,
                nose_factor: needed(2)?,
                strength,
                density: needed(4)?,
                static_factor,
                inertia_factor: self.numbers[7].unwrap_or(1.0),
                crater_ratio: self.numbers[8].unwrap_or(2.0),
                crater_stiffness: self.numbers[9].map_or(CraterStiffness::Continuous, CraterStiffness::Given),
                layers: Vec::new(),
            }),
            thickness: self.numbers[5],
            criterion: match self.criterion {
                None | Some("" | "full-depth") => Criterion::FullDepth,
                Some("ndrc") => Criterion::Ndrc,
                Some(other) => {
                    return Err(format!("criterion: `{}` is not full-depth or ndrc", shortened(other)));
                }
            },
            velocity: Some(needed(10)?),
        })
    }
}

/// Rows of a table, some thousands of them.
#[derive(Debug)]
pub enum Rows {
    /// Records of a CSV table.
    Csv(csv::Records),
    /// Columns of a Parquet table.
    #[cfg(feature = "parquet")]
    Parquet(Box<super::parquet::Columns>),
    /// Random scenes of a seed, by their numbers from 0; the first is a multiple of [`PART`].
    Random {
        /// Seed.
        seed: u64,
        /// Which scenes.
        rows: Range<u64>,
    },
}

impl Rows {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Csv(records) => records.len(),
            #[cfg(feature = "parquet")]
            Self::Parquet(columns) => columns.len(),
            Self::Random { rows, .. } => (rows.end - rows.start) as usize,
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where row `index` stands in its table, for messages; a random scene stands in none.
    fn place(&self, index: usize) -> Option<String> {
        match self {
            Self::Csv(records) => Some(format!("line {}", records.line(index))),
            #[cfg(feature = "parquet")]
            Self::Parquet(columns) => Some(format!("row {}", columns.row(index))),
            Self::Random { .. } => None,
        }
    }

    /// What the rows `part` are answered, as by [`answers`]; messages name the row's place in its table.
    ///
    /// `part` begins at a multiple of [`PART`] and is no longer than that.
    pub fn answers(&self, part: Range<usize>, method: &Method, with_critical: bool) -> Vec<Result<Answer, String>> {
        let mut answers = answers(&self.scenes(part.clone()), method, with_critical);
        for (index, answer) in part.zip(&mut answers) {
            let (Err(message) | Ok(Answer { critical: Some(Err(Gap { message, .. })), .. })) = answer else { continue };
            if let Some(place) = self.place(index) {
                message.insert_str(0, &format!("{place}: "));
            }
        }
        answers
    }

    /// The scenes of `part`, which begins at a multiple of [`PART`] and is no longer than that.
    pub fn scenes(&self, part: Range<usize>) -> Vec<Result<Scene, String>> {
        match self {
            Self::Csv(records) => part.map(|index| records.scene(index)).collect(),
            #[cfg(feature = "parquet")]
            Self::Parquet(columns) => part.map(|index| columns.scene(index)).collect(),
            Self::Random { seed, rows } => {
                let first = rows.start + part.start as u64;
                random_rows(*seed, first / PART as u64).take(part.len()).map(Ok).collect()
            }
        }
    }
}

/// The scenes of part `part` of the endless random table with `seed`; a part has [`PART`] rows.
pub fn random_rows(seed: u64, part: u64) -> impl Iterator<Item = Scene> {
    let mut generator = Generator::new(seed, &format!("batch {part}"));
    std::iter::repeat_with(move || generator.next_scene()).take(PART)
}

/// What a row is answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The flight.
    pub flight: Summary,
    /// Critical velocity [m/s], where it was asked for and the target has a thickness, or why there is none.
    pub critical: Option<Result<f64, Gap>>,
    /// Whether a fixed step kept its limit; true for every other method.
    pub stable: bool,
}

/// Why a critical velocity is missing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The cause.
    pub message: String,
    /// Whether it lies within its error bar, and nothing failed.
    pub is_undecided: bool,
}

impl Answer {
    /// Its numbers, in the order of [`RESULT_COLUMNS`].
    fn numbers(&self) -> [Option<f64>; RESULT_NUMBERS] {
        let Summary { end, crater_end, exit_margin, .. } = self.flight;
        [
            Some(end.depth),
            Some(end.time),
            Some(end.velocity),
            crater_end.map(|s| s.time),
            crater_end.map(|s| s.velocity),
            exit_margin,
            self.critical.as_ref().and_then(|critical| critical.as_ref().ok()).copied(),
        ]
    }

    /// Why its critical velocity is missing, if that was asked for.
    fn gap(&self) -> Option<&Gap> {
        self.critical.as_ref()?.as_ref().err()
    }
}

/// The message of an answer: why it is none, or what it lacks.
fn message(answer: &Result<Answer, String>) -> Option<&str> {
    match answer {
        Ok(answer) => answer.gap().map(|gap| gap.message.as_str()),
        Err(message) => Some(message),
    }
}

/// Flies `scenes` by `method`, and finds the critical velocity of those with a thickness if `with_critical`.
///
/// The default Taylor method flies in lanes ([`Batch`]), any other row by row. An error is what is wrong with the
/// row, or what could not be computed; it stops no other row.
pub fn answers(scenes: &[Result<Scene, String>], method: &Method, with_critical: bool) -> Vec<Result<Answer, String>> {
    let mut problems = Vec::with_capacity(scenes.len());
    // What a scene without a problem has instead.
    let causes: Vec<Option<String>> = scenes
        .iter()
        .map(|scene| match scene {
            Ok(scene) => scene.problem().map(|problem| problems.push(problem)).err().map(|error| error.to_string()),
            Err(cause) => Some(cause.clone()),
        })
        .collect();
    let answer = |flight, stable| Answer { flight, critical: None, stable };
    let flown: Vec<Result<Answer, IntegrationError>> = match method {
        Method::Taylor(taylor) if *taylor == Taylor::default() => {
            Batch::new().fly(&problems).into_iter().map(|flight| Ok(answer(flight?, true))).collect()
        }
        _ => keeping(method.integrator(), |integrator| {
            let fly = |problem: &Problem| {
                let flight = integrator.fly(problem, Detail::Events)?;
                Ok(answer(Summary::from(&flight), flight.step_limit.is_none_or(|limit| limit.stable)))
            };
            problems.iter().map(fly).collect()
        }),
    };
    let mut flown = flown.into_iter();
    let mut answers: Vec<Result<Answer, String>> = causes
        .into_iter()
        .map(|cause| match cause {
            Some(cause) => Err(cause),
            None => flown.next().map_or_else(|| Err("no answer".to_owned()), |a| a.map_err(|error| error.to_string())),
        })
        .collect();
    if with_critical {
        for (answer, scene) in answers.iter_mut().zip(scenes) {
            let (Ok(found), Ok(scene)) = (answer, scene) else { continue };
            if scene.thickness.is_some() {
                let critical = critical_velocity::of_scene(scene, method.integrator());
                found.critical = Some(critical.map(|critical| critical.velocity).map_err(|error| Gap {
                    message: error.to_string(),
                    is_undecided: matches!(error, CriticalError::Undecided { .. }),
                }));
            }
        }
    }
    answers
}

/// How many rows came to what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// All rows.
    pub rows: u64,
    /// Without a flight, or without the critical velocity that was asked for.
    pub bad: u64,
    /// With the outcome or the critical velocity undecided.
    pub undecided: u64,
    /// Flown with a step beyond the limit of the scheme.
    pub unstable: u64,
}

impl Tally {
    /// Counts `answers`.
    pub fn count(&mut self, answers: &[Result<Answer, String>]) {
        for answer in answers {
            self.rows += 1;
            let Ok(answer) = answer else {
                self.bad += 1;
                continue;
            };
            self.unstable += u64::from(!answer.stable);
            match answer.gap() {
                Some(gap) if !gap.is_undecided => self.bad += 1,
                gap => {
                    self.undecided += u64::from(gap.is_some() || answer.flight.outcome == Outcome::Undecided);
                }
            }
        }
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.rows += other.rows;
        self.bad += other.bad;
        self.undecided += other.undecided;
        self.unstable += other.unstable;
    }
}

/// Lines of results, each with its end; the first has the number `first`, from 1.
pub fn result_lines(first: u64, answers: &[Result<Answer, String>]) -> String {
    let mut text = String::with_capacity(160 * answers.len());
    for (row, answer) in (first..).zip(answers) {
        // Writing to a string cannot fail.
        let _ = write!(text, "{row},");
        match answer {
            Ok(answer) => {
                text.push_str(answer.flight.outcome.name());
                for value in answer.numbers() {
                    text.push(',');
                    if let Some(value) = value {
                        push_number(&mut text, value);
                    }
                }
            }
            // No outcome and no number.
            Err(_) => text.push_str(",,,,,,,"),
        }
        text.push(',');
        if let Some(message) = message(answer) {
            push_quoted(&mut text, message);
        }
        text.push('\n');
    }
    text
}

/// The same results column by column, in the order of [`RESULT_COLUMNS`].
pub fn result_columns(first: u64, answers: &[Result<Answer, String>]) -> Vec<Cells> {
    let mut outcomes = Vec::with_capacity(answers.len());
    let mut numbers: [Vec<Option<f64>>; RESULT_NUMBERS] = std::array::from_fn(|_| Vec::with_capacity(answers.len()));
    let mut errors: Vec<Option<Cow<'static, str>>> = Vec::with_capacity(answers.len());
    for answer in answers {
        let found = answer.as_ref().ok();
        outcomes.push(found.map(|answer| Cow::Borrowed(answer.flight.outcome.name())));
        let row = found.map_or([None; RESULT_NUMBERS], Answer::numbers);
        for (column, number) in numbers.iter_mut().zip(row) {
            column.push(number);
        }
        errors.push(message(answer).map(|message| message.chars().map(printable).collect()));
    }
    let rows = Cells::Counts((first..).take(answers.len()).collect());
    let mut columns = vec![rows, Cells::Texts(outcomes)];
    columns.extend(numbers.into_iter().map(Cells::Numbers));
    columns.push(Cells::Texts(errors));
    columns
}

/// The first line of a CSV table of results, with its end.
pub fn result_header() -> String {
    RESULT_COLUMNS.map(|(name, _)| name).join(",") + "\n"
}

/// The shortest digits that read back to the same number; with an exponent where there would be many zeros.
fn push_number(text: &mut String, value: f64) {
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format(value);
    text.push_str(digits.strip_suffix(".0").unwrap_or(digits));
}

/// A character as a message in a table may have it: messages are one line.
fn printable(c: char) -> char {
    if steers(c) { ' ' } else { c }
}

/// A message as one CSV cell.
fn push_quoted(text: &mut String, message: &str) {
    text.push('"');
    for c in message.chars() {
        match c {
            '"' => text.push_str("\"\""),
            c => text.push(printable(c)),
        }
    }
    text.push('"');
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    fn layout(names: &str) -> Result<Layout, TableError> {
        Layout::new(names.split(','), |column| Place { file: "t.csv".to_owned(), line: 1, column })
    }

    #[test]
    fn defaults_fill_what_a_row_leaves_empty() {
        let mut row = Row::default();
        for (index, value) in [(0, 2.0), (1, 0.05), (2, 0.72), (3, 36e6), (4, 2300.0), (10, 300.0)] {
            row.numbers[index] = Some(value);
        }
        let scene = row.scene().unwrap();
        let concrete = scene.concrete().unwrap();
        // Eq. 14: 72/sqrt(36).
        assert_eq!((concrete.static_factor, concrete.inertia_factor, concrete.crater_ratio), (12.0, 1.0, 2.0));
        let method = Method::Taylor(Taylor::default());
        let answer = answers(&[Ok(scene)], &method, true).remove(0).unwrap();
        assert!((answer.flight.end.depth - 0.144_826_200_112_217_07).abs() < 1e-15);
        assert_eq!(answer.critical, None);
        row.numbers[0] = Some(-2.0);
        assert!(answers(&[row.scene()], &method, false)[0].as_ref().unwrap_err().contains("mass"));
        row.numbers[10] = None;
        assert_eq!(row.scene().unwrap_err(), "velocity_m_s: empty, and every scene needs it");
        row.criterion = Some("half");
        row.numbers[10] = Some(1.0);
        assert_eq!(row.scene().unwrap_err(), "criterion: `half` is not full-depth or ndrc");
    }

    #[test]
    fn a_header_that_cannot_be_used_is_refused_at_its_column() {
        let refusal = |names: &str| layout(names).unwrap_err().to_string();
        assert_eq!(
            refusal("mass_kg,diametre_m"),
            "t.csv:1, column 2: there is no column `diametre_m`; is `diameter_m` meant?"
        );
        assert_eq!(refusal("mass_kg,mass_kg"), "t.csv:1, column 2: the column `mass_kg` is there twice");
        assert_eq!(refusal("mass_kg"), "t.csv:1: the column `diameter_m` is missing");
        assert_eq!(
            refusal("2.0,0.05"),
            "t.csv:1, column 1: the first line must name the columns, and this one holds numbers"
        );
        let full = layout("velocity_m_s,mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3").unwrap();
        assert_eq!((full.width, full.places[0], full.places[10], full.places[5]), (6, Some(1), Some(0), None));
    }

    #[test]
    fn a_message_is_one_cell_whatever_it_quotes() {
        assert_eq!(result_lines(3, &[Err("a \"b\"\nc\u{202e}".to_owned())]), "3,,,,,,,,,\"a \"\"b\"\" c \"\n");
    }

    #[test]
    fn numbers_read_back_to_the_same_number() {
        for value in [0.0, -0.0, 1.0 / 3.0, 5e-324, 1.797e308, 1e-7, 123_456_789.125, -2.5e-12] {
            let mut text = String::new();
            push_number(&mut text, value);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            assert!(text.len() < 26, "{text}");
        }
    }

    #[test]
    fn a_random_table_is_the_same_however_it_is_cut() {
        let whole = Rows::Random { seed: 3, rows: 0..4096 };
        let later = Rows::Random { seed: 3, rows: 2048..4096 };
        assert_eq!(whole.scenes(2048..3072), later.scenes(0..1024));
        assert_ne!(whole.scenes(0..10), whole.scenes(1024..1034));
    }
}
