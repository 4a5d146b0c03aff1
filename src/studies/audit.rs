//! What are step-size results worth that another code produced?
//!
//! A table of `dt_s` and results comes in ([`Table::read`]), a verdict comes out ([`audit`]): order with interval,
//! class, error bars by named rules, and agreement with the exact values where they are known.
//!
//! What is wrong with a table is named for what it is and never passes. A table that cannot be judged is an
//! [`AuditError`] with file, line and column (exit code 2); NaN, divergence, oscillation, a missed order and a wrong
//! limit fail (3); constants, zero errors and noise leave it undecided (4). Rows out of order and rows that say the
//! same twice are put right and mentioned.

use serde::Serialize;
use thiserror::Error;

use super::grid_convergence::{
    Behaviour, EcaHoekstra, GridValue, ThreeGrids, Uncertainty, eca_hoekstra, roache, self_convergence, three_grids,
    xing_stern,
};
use super::order::{Class, Exclusion, OrderVerdict, STEPS_MIN, StepError, fit_at_level};
use super::quantity::Quantity;

/// Two-sided level of the intervals behind a verdict on one table.
///
/// Coarser than that of a suite, which judges a hundred fits of sixty points at once: four rows leave one degree of
/// freedom, and at 10⁻⁶ nothing could be said of them.
pub const AUDIT_LEVEL: f64 = 1e-3;

/// Grids closer than this ratio are not used in the three-grid rules (Celik et al. 2008).
const RATIO_MIN: f64 = 1.3;

/// Where in the file something stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// File name as given.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Column, from 1; 0 for the whole line.
    pub column: usize,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.file, self.line)?;
        if self.column > 0 { write!(f, ", column {}", self.column) } else { Ok(()) }
    }
}

/// Why a table cannot be judged (exit code 2).
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AuditError {
    /// Not text, or no CSV.
    #[error("{place}: {cause}")]
    NotCsv {
        /// Where.
        place: Place,
        /// What the reader said.
        cause: String,
    },
    /// No row at all.
    #[error("{file}: the file is empty")]
    Empty {
        /// File.
        file: String,
    },
    /// The first row holds numbers.
    #[error("{place}: the first row must name the columns, and this one holds numbers")]
    NoHeader {
        /// Where.
        place: Place,
    },
    /// A column of another name.
    #[error("{place}: there is no column `{name}`")]
    UnknownColumn {
        /// Where.
        place: Place,
        /// Name found.
        name: String,
    },
    /// A name twice.
    #[error("{place}: the column `{name}` is there twice")]
    ColumnTwice {
        /// Where.
        place: Place,
        /// Name.
        name: String,
    },
    /// No `dt_s`.
    #[error("{place}: the column `dt_s` is missing")]
    NoSteps {
        /// Where.
        place: Place,
    },
    /// Nothing but `dt_s`.
    #[error("{place}: there is no column of results")]
    NoResults {
        /// Where.
        place: Place,
    },
    /// A row longer or shorter than the header.
    #[error("{place}: {found} cells in a table of {expected} columns")]
    Ragged {
        /// Where.
        place: Place,
        /// Cells found.
        found: usize,
        /// Cells expected.
        expected: usize,
    },
    /// A cell that is no number.
    #[error("{place}: `{text}` in `{name}` is not a number")]
    NotANumber {
        /// Where.
        place: Place,
        /// Column name.
        name: String,
        /// Text found, empty for an empty cell.
        text: String,
    },
    /// A step that is zero or negative.
    #[error("{place}: the step {step} s is not positive")]
    BadStep {
        /// Where.
        place: Place,
        /// Step [s].
        step: f64,
    },
    /// Two results for one step.
    #[error("{place}: the step {step} s has two values of `{name}`, {second} here and {first} in line {other}")]
    TwoValues {
        /// Where the second stands.
        place: Place,
        /// Step [s].
        step: f64,
        /// Column name.
        name: &'static str,
        /// Value in the earlier line.
        first: f64,
        /// Value here.
        second: f64,
        /// The earlier line.
        other: u64,
    },
    /// Fewer than [`STEPS_MIN`] different steps.
    #[error("{file}: {found} different steps, and an order needs {STEPS_MIN}")]
    TooFewSteps {
        /// File.
        file: String,
        /// Steps found.
        found: usize,
    },
    /// An order to compare with that is none.
    #[error("the order {order} is not a positive number")]
    BadOrder {
        /// Order given.
        order: f64,
    },
}

impl AuditError {
    /// Exit code of the contract: 2, usage or input.
    pub fn exit_code(&self) -> u8 {
        2
    }

    /// What to change.
    pub fn help(&self) -> String {
        let names = || Quantity::ALL.map(column_name).join(", ");
        match self {
            Self::NotCsv { .. } => "give a comma-separated table in UTF-8".to_owned(),
            Self::Empty { .. } | Self::NoHeader { .. } | Self::NoResults { .. } | Self::NoSteps { .. } => {
                format!("start with a line of names: dt_s and any of {}", names())
            }
            Self::UnknownColumn { name, .. } if name.contains([';', '\t']) => {
                "separate the cells by commas, and write decimals with a point".to_owned()
            }
            Self::UnknownColumn { .. } => {
                format!("allowed are dt_s, {}: rename the column, convert its unit, or remove it", names())
            }
            Self::ColumnTwice { .. } => "remove one of the two".to_owned(),
            Self::Ragged { .. } => "complete the row, or remove it".to_owned(),
            Self::NotANumber { text, .. } if text.is_empty() => {
                "fill the cell, or remove the row or the column: a missing result is no result".to_owned()
            }
            Self::NotANumber { .. } => "write numbers with a decimal point and without units: 1.25e-6".to_owned(),
            Self::BadStep { .. } => "a step is a time in seconds above zero".to_owned(),
            Self::TwoValues { .. } => {
                "keep one of them: a result that a step does not determine has no order".to_owned()
            }
            Self::TooFewSteps { .. } => "run the other code with more steps, best at ratios of 1.5 to 2".to_owned(),
            Self::BadOrder { .. } => "give the formal order of the other scheme, 1 or 2".to_owned(),
        }
    }
}

/// Name of the column of a quantity in the contract.
pub fn column_name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Depth => "depth_m",
        Quantity::Time => "time_s",
        Quantity::Velocity => "velocity_m_s",
        Quantity::CraterEndTime => "crater_end_time_s",
        Quantity::CraterEndVelocity => "crater_end_velocity_m_s",
        Quantity::CriticalVelocity => "critical_velocity_m_s",
    }
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// Rows were out of order, and are sorted.
    Unsorted,
    /// Rows said the same twice, and are merged.
    DuplicateRows,
    /// A column without any value is left out.
    EmptyColumn,
    /// NaN or infinity.
    NotFinite,
    /// The values do not depend on the step.
    Constant,
    /// The errors are zero or round-off.
    ZeroError,
    /// No law can be told from chance.
    Noise,
    /// The values run away.
    Diverging,
    /// The values alternate.
    Oscillating,
    /// The order is not the one asked for.
    OrderMissed,
    /// The order asked for is not told from its neighbours.
    OrderUnclear,
    /// The values approach something else than the exact value.
    WrongLimit,
}

/// One remark about the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What it is about.
    pub kind: FindingKind,
    /// Column it concerns; `null` for the whole table.
    pub quantity: Option<Quantity>,
    /// The remark, one sentence with its numbers.
    pub message: String,
}

/// A table as read: steps ascending and different, one value each.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    file: String,
    rows: Vec<Row>,
    columns: Vec<Column>,
    findings: Vec<Finding>,
}

#[derive(Clone, Debug, PartialEq)]
struct Row {
    line: u64,
    step: f64,
    /// One per column of the table.
    values: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq)]
struct Column {
    quantity: Quantity,
    /// Half a unit of the last digit printed, the finest in the column: short numbers may be exact.
    rounding: f64,
}

impl Table {
    /// Reads a CSV table; `file` is its name in messages.
    ///
    /// A byte order mark, CRLF, quotes, blanks around cells, blank lines and lines that start with `#` are allowed.
    ///
    /// # Errors
    /// [`AuditError`] with the place: every cell must be a number (`nan` and `inf` are read, and fail later), every row
    /// complete, every name known and there once, every step positive, with one value, and four of them different.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, AuditError> {
        let place = |line, column| Place { file: file.to_owned(), line, column };
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(bytes);
        let mut records = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| AuditError::NotCsv {
                place: place(error.position().map_or(1, csv::Position::line), 0),
                cause: match error.kind() {
                    csv::ErrorKind::Utf8 { .. } => "the file is not UTF-8 text".to_owned(),
                    _ => error.to_string(),
                },
            })?;
            let line = record.position().map_or(0, csv::Position::line);
            records.push((line, record));
        }
        let Some(((header_line, header), records)) = records.split_first() else {
            return Err(AuditError::Empty { file: file.to_owned() });
        };
        let names = header_names(header, |column| place(*header_line, column))?;
        let mut table = Self { file: file.to_owned(), rows: Vec::new(), columns: Vec::new(), findings: Vec::new() };
        let mut cells = Vec::new();
        for (line, record) in records {
            if record.len() != names.len() {
                let (found, expected) = (record.len(), names.len());
                return Err(AuditError::Ragged { place: place(*line, 0), found, expected });
            }
            cells.push((*line, record));
        }
        // A column of a template that was never filled says nothing; a gap in a column that is used hides something.
        let empty = |index: usize| cells.iter().all(|(_, record)| record[index].is_empty());
        let mut taken = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let Some(quantity) = *name else { continue };
            if empty(index) {
                table.remark(FindingKind::EmptyColumn, Some(quantity), "the column is empty and left out".to_owned());
            } else {
                taken.push((index, quantity));
                table.columns.push(Column { quantity, rounding: f64::INFINITY });
            }
        }
        if taken.is_empty() {
            return Err(AuditError::NoResults { place: place(*header_line, 0) });
        }
        let step_index = names.iter().position(Option::is_none).unwrap_or(0);
        for (line, record) in cells {
            let number = |index: usize| {
                let text = &record[index];
                parse(text).ok_or_else(|| AuditError::NotANumber {
                    place: place(line, index + 1),
                    name: header[index].to_owned(),
                    text: text.to_owned(),
                })
            };
            let step = number(step_index)?;
            if step <= 0.0 {
                return Err(AuditError::BadStep { place: place(line, step_index + 1), step });
            }
            let mut values = Vec::new();
            for (column, &(index, _)) in table.columns.iter_mut().zip(&taken) {
                values.push(number(index)?);
                column.rounding = column.rounding.min(half_last_digit(&record[index]));
            }
            table.rows.push(Row { line, step, values });
        }
        table.put_in_order(&taken)?;
        Ok(table)
    }

    fn remark(&mut self, kind: FindingKind, quantity: Option<Quantity>, message: String) {
        self.findings.push(Finding { kind, quantity, message });
    }

    /// Sorts by step, merges equal rows, refuses two values at one step.
    fn put_in_order(&mut self, taken: &[(usize, Quantity)]) -> Result<(), AuditError> {
        let ascending = self.rows.windows(2).all(|pair| pair[0].step <= pair[1].step);
        let descending = self.rows.windows(2).all(|pair| pair[0].step >= pair[1].step);
        if !ascending && !descending {
            self.remark(
                FindingKind::Unsorted,
                None,
                "the rows are not in the order of the step and were sorted".into(),
            );
        }
        self.rows.sort_by(|a, b| a.step.total_cmp(&b.step).then(a.line.cmp(&b.line)));
        let mut merged = Vec::new();
        let mut kept: Vec<Row> = Vec::new();
        for row in std::mem::take(&mut self.rows) {
            let Some(before) = kept.last().filter(|before| before.step == row.step) else {
                kept.push(row);
                continue;
            };
            for (i, (&first, &second)) in before.values.iter().zip(&row.values).enumerate() {
                // NaN twice is the same cell twice; -0 and 0 are one value.
                if first != second && !(first.is_nan() && second.is_nan()) {
                    return Err(AuditError::TwoValues {
                        place: Place { file: self.file.clone(), line: row.line, column: taken[i].0 + 1 },
                        step: row.step,
                        name: column_name(taken[i].1),
                        first,
                        second,
                        other: before.line,
                    });
                }
            }
            merged.push(row.line.to_string());
        }
        if !merged.is_empty() {
            let message = format!("{} repeated another row and was merged with it", lines(&merged));
            self.remark(FindingKind::DuplicateRows, None, message);
        }
        let found = kept.iter().filter(|row| row.step.is_finite()).count();
        if found < STEPS_MIN {
            return Err(AuditError::TooFewSteps { file: self.file.clone(), found });
        }
        self.rows = kept;
        Ok(())
    }
}

fn lines(lines: &[String]) -> String {
    if lines.len() == 1 { format!("line {}", lines[0]) } else { format!("each of lines {}", lines.join(", ")) }
}

/// The quantity of each column, `None` for the one of steps.
fn header_names(
    header: &csv::StringRecord,
    place: impl Fn(usize) -> Place,
) -> Result<Vec<Option<Quantity>>, AuditError> {
    if header.iter().all(|cell| parse(cell).is_some()) {
        return Err(AuditError::NoHeader { place: place(0) });
    }
    let mut names = Vec::new();
    for (index, cell) in header.iter().enumerate() {
        let name = if cell == "dt_s" {
            None
        } else {
            let found = Quantity::ALL.into_iter().find(|&quantity| column_name(quantity) == cell);
            let unknown = || AuditError::UnknownColumn { place: place(index + 1), name: cell.to_owned() };
            Some(found.ok_or_else(unknown)?)
        };
        if names.contains(&name) {
            return Err(AuditError::ColumnTwice { place: place(index + 1), name: cell.to_owned() });
        }
        names.push(name);
    }
    if !names.contains(&None) {
        return Err(AuditError::NoSteps { place: place(0) });
    }
    if names.len() == 1 {
        return Err(AuditError::NoResults { place: place(0) });
    }
    Ok(names)
}

/// A number as codes print them, NaN and infinity included also as the Microsoft runtime writes them (`1.#IND`).
fn parse(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    if lower.contains("#inf") {
        return Some(f64::INFINITY);
    }
    if lower.contains("#ind") || lower.contains("#qnan") || lower.starts_with("nan(") || lower.starts_with("-nan(") {
        return Some(f64::NAN);
    }
    text.parse().ok()
}

/// Half a unit of the last digit of a decimal number; zero for what has no digits.
fn half_last_digit(text: &str) -> f64 {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    if !mantissa.contains(|c: char| c.is_ascii_digit()) {
        return 0.0;
    }
    let decimals = mantissa.split_once('.').map_or(0, |(_, fraction)| fraction.len()) as i32;
    exponent.parse::<i32>().map_or(0.0, |exponent| 0.5 * 10_f64.powi(exponent.saturating_sub(decimals)))
}

/// Exact values to compare with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExactValues {
    /// Impact velocity V0 [m/s]: every velocity error is relative to it.
    pub impact_velocity: f64,
    /// Depth at the end [m].
    pub depth: Option<f64>,
    /// Time of the end [s].
    pub time: Option<f64>,
    /// Velocity at the end [m/s].
    pub velocity: Option<f64>,
    /// Time at x = k d [s].
    pub crater_end_time: Option<f64>,
    /// Velocity at x = k d [m/s].
    pub crater_end_velocity: Option<f64>,
    /// Critical velocity [m/s].
    pub critical_velocity: Option<f64>,
}

impl ExactValues {
    /// The exact value of a quantity and what its errors are relative to; `None` where either is not known or the
    /// latter is zero.
    fn of(&self, quantity: Quantity) -> Option<(f64, f64)> {
        let (value, scale) = match quantity {
            Quantity::Depth => (self.depth?, self.depth?),
            Quantity::Time => (self.time?, self.time?),
            Quantity::CraterEndTime => (self.crater_end_time?, self.crater_end_time?),
            Quantity::Velocity => (self.velocity?, self.impact_velocity),
            Quantity::CraterEndVelocity => (self.crater_end_velocity?, self.impact_velocity),
            Quantity::CriticalVelocity => (self.critical_velocity?, self.impact_velocity),
        };
        (value.is_finite() && scale.is_finite() && scale != 0.0).then_some((value, scale.abs()))
    }
}

/// What to compare a table with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Expectation {
    /// Formal order of the other scheme, for every column.
    pub order: Option<f64>,
    /// Exact values, if a scene is given.
    pub exact: Option<ExactValues>,
}

/// A judgement. The order of the variants is the order of severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Converging, and as expected where something was expected.
    Passed,
    /// Cannot be told.
    Undecided,
    /// A criterion failed.
    Failed,
}

/// One row of one column.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AuditPoint {
    /// Step [s].
    pub dt_s: f64,
    /// Value in the table.
    pub value: f64,
    /// Size of its error, relative as in `converge`: against the exact value, else against the limit found; `null`
    /// where there is neither.
    pub error: Option<f64>,
    /// Whether the order rests on it.
    pub used: bool,
    /// Why not.
    pub excluded: Option<Exclusion>,
}

/// The judgement of one column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuantityAudit {
    /// Which quantity.
    pub quantity: Quantity,
    /// Order expected, if one was given.
    pub formal_order: Option<f64>,
    /// Order found.
    pub observed_order: Option<f64>,
    /// Its 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Its interval at [`AUDIT_LEVEL`], on which the verdict rests.
    pub verdict_band: Option<[f64; 2]>,
    /// Constant C of the relative error `C dt^p`.
    pub error_constant: Option<f64>,
    /// What the values do.
    pub class: Class,
    /// Judgement of this column.
    pub verdict: Verdict,
    /// Why, in one clause.
    pub reason: String,
    /// How the order was found.
    pub rule: &'static str,
    /// Limit for dt -> 0, in the unit of the column.
    pub limit: Option<f64>,
    /// Interval of the limit at [`AUDIT_LEVEL`].
    pub limit_band: Option<[f64; 2]>,
    /// Exact value, if known.
    pub exact: Option<f64>,
    /// Whether the values approach it; `null` where it or the limit is not known.
    pub agrees_with_exact: Option<bool>,
    /// Error bars of the value at the finest step, each by its rule.
    pub error_bands: Vec<Uncertainty>,
    /// The three-grid rule on the finest grids at least 1.3 apart.
    pub three_grids: Option<ThreeGrids>,
    /// Least squares of Eça and Hoekstra.
    pub least_squares: Option<EcaHoekstra>,
    /// Every row.
    pub points: Vec<AuditPoint>,
}

/// The judgement of a table: what `penetrode audit --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Audit {
    /// `penetrode/audit/1`.
    pub schema: &'static str,
    /// Worst verdict of the columns.
    pub verdict: Verdict,
    /// Remarks on the table and its columns.
    pub findings: Vec<Finding>,
    /// One per column, in the order of the table.
    pub quantities: Vec<QuantityAudit>,
}

impl Audit {
    /// Exit code of the contract: 0 passed, 3 failed, 4 undecided.
    pub fn exit_code(&self) -> u8 {
        match self.verdict {
            Verdict::Passed => 0,
            Verdict::Failed => 3,
            Verdict::Undecided => 4,
        }
    }
}

/// Judges a table.
///
/// Against exact values the order is fitted to the errors ([`super::order`]), and the limit of the values must agree;
/// without, order and limit are fitted together ([`self_convergence`]).
///
/// # Errors
/// [`AuditError::BadOrder`] for an expected order that is not a positive number.
pub fn audit(table: &Table, expectation: &Expectation) -> Result<Audit, AuditError> {
    if let Some(order) = expectation.order.filter(|&order| !(order > 0.0 && order.is_finite())) {
        return Err(AuditError::BadOrder { order });
    }
    let mut findings = table.findings.clone();
    let mut quantities = Vec::new();
    for index in 0..table.columns.len() {
        let (judged, remarks) = judge(table, index, expectation);
        findings.extend(remarks);
        quantities.push(judged);
    }
    // A table always has a column.
    let verdict = quantities.iter().map(|column| column.verdict).max().unwrap_or(Verdict::Undecided);
    Ok(Audit { schema: "penetrode/audit/1", verdict, findings, quantities })
}

/// Order and class of a column, from whichever rule applies.
struct Observed {
    order: f64,
    interval: [f64; 2],
    band: [f64; 2],
    constant: f64,
}

fn judge(table: &Table, index: usize, expectation: &Expectation) -> (QuantityAudit, Vec<Finding>) {
    let column = &table.columns[index];
    let quantity = column.quantity;
    let mut findings = Vec::new();
    let mut remark = |kind, message: &str| {
        findings.push(Finding { kind, quantity: Some(quantity), message: message.to_owned() });
    };
    let mut judged = QuantityAudit {
        quantity,
        formal_order: expectation.order,
        observed_order: None,
        interval: None,
        verdict_band: None,
        error_constant: None,
        class: Class::Undecided,
        verdict: Verdict::Failed,
        reason: String::new(),
        rule: "none",
        limit: None,
        limit_band: None,
        exact: None,
        agrees_with_exact: None,
        error_bands: Vec::new(),
        three_grids: None,
        least_squares: None,
        points: Vec::new(),
    };
    for row in &table.rows {
        let (dt_s, value) = (row.step, row.values[index]);
        judged.points.push(AuditPoint { dt_s, value, error: None, used: false, excluded: None });
    }
    if let Some(row) = table.rows.iter().find(|row| !row.step.is_finite() || !row.values[index].is_finite()) {
        judged.reason =
            format!("{}:{}: {} at the step {} s is not finite", table.file, row.line, row.values[index], row.step);
        remark(FindingKind::NotFinite, &judged.reason);
        return (judged, findings);
    }
    let grids: Vec<GridValue> = table
        .rows
        .iter()
        .map(|row| {
            let value = row.values[index];
            GridValue { step: row.step, value, round_off: column.rounding.max(0.5 * f64::EPSILON * value.abs()) }
        })
        .collect();
    let (Ok(own), Ok(least_squares)) = (self_convergence(&grids, AUDIT_LEVEL), eca_hoekstra(&grids)) else {
        // Reading has already refused every table that these refuse.
        "the table cannot be fitted".clone_into(&mut judged.reason);
        return (judged, findings);
    };
    let converges = own.behaviour == Behaviour::MonotoneConverging;
    if converges {
        judged.limit = Some(own.limit);
        judged.limit_band = own.limit_band.iter().all(|end| end.is_finite()).then_some(own.limit_band);
    }
    let exact = expectation.exact.and_then(|exact| exact.of(quantity));
    judged.exact = exact.map(|(value, _)| value);
    let observed = match exact {
        Some((exact, scale)) => against_exact(&mut judged, &grids, exact, scale),
        None => against_limit(&mut judged, &own),
    };
    if let (Some(exact), true) = (judged.exact, converges) {
        let finest = grids[0];
        let bar = least_squares.uncertainty.map_or(0.0, |bar| bar.half_width) + finest.round_off;
        let [low, high] = own.limit_band;
        judged.agrees_with_exact = Some(
            (finest.value - exact).abs() <= bar || (low - finest.round_off..=high + finest.round_off).contains(&exact),
        );
    }
    if own.behaviour == Behaviour::Constant && judged.class != Class::AtFloor {
        judged.class = Class::Undecided;
        judged.reason = own.reason;
    } else if judged.class == Class::Undecided && own.behaviour.class() == Class::Oscillating {
        // Against an exact value that they alternate on one side of, the values still alternate.
        judged.class = Class::Oscillating;
        judged.reason = own.reason;
    }
    judged.verdict = match judged.class {
        Class::Diverging => {
            remark(FindingKind::Diverging, &judged.reason);
            Verdict::Failed
        }
        Class::Oscillating => {
            remark(FindingKind::Oscillating, &judged.reason);
            Verdict::Failed
        }
        Class::AtFloor => {
            remark(FindingKind::ZeroError, &judged.reason);
            Verdict::Undecided
        }
        Class::Undecided => {
            let constant = own.behaviour == Behaviour::Constant;
            remark(if constant { FindingKind::Constant } else { FindingKind::Noise }, &judged.reason);
            Verdict::Undecided
        }
        Class::Converging => match (expectation.order, observed.as_ref()) {
            (Some(formal), Some(observed)) => {
                let (verdict, text) = against_formal(observed, formal);
                match verdict {
                    Verdict::Failed => remark(FindingKind::OrderMissed, &text),
                    Verdict::Undecided => remark(FindingKind::OrderUnclear, &text),
                    Verdict::Passed => (),
                }
                verdict
            }
            (None, Some(_)) => Verdict::Passed,
            (_, None) => Verdict::Undecided,
        },
    };
    if judged.agrees_with_exact == Some(false) {
        let text =
            format!("the values approach {:.6e} and not the exact {:.6e}", own.limit, judged.exact.unwrap_or(f64::NAN));
        remark(FindingKind::WrongLimit, &text);
        judged.verdict = Verdict::Failed;
    }
    if let Some(observed) = &observed {
        judged.observed_order = Some(observed.order);
        judged.interval = Some(observed.interval);
        judged.verdict_band = Some(observed.band);
        judged.error_constant = Some(observed.constant);
    }
    add_bands(&mut judged, &grids, least_squares, expectation.order);
    (judged, findings)
}

/// Whether the band holds the formal order and not its neighbours.
fn against_formal(observed: &Observed, formal: f64) -> (Verdict, String) {
    let [low, high] = observed.band;
    let holds = |order: f64| low <= order && order <= high;
    let text = format!("order {:.2} [{low:.2}, {high:.2}] where {formal} is expected", observed.order);
    if !holds(formal) {
        (Verdict::Failed, text)
    } else if holds(formal - 1.0) || holds(formal + 1.0) {
        (Verdict::Undecided, format!("{text}: too wide to tell"))
    } else {
        (Verdict::Passed, text)
    }
}

/// Fits the order of the errors against an exact value.
fn against_exact(judged: &mut QuantityAudit, grids: &[GridValue], exact: f64, scale: f64) -> Option<Observed> {
    let points: Vec<StepError> = grids
        .iter()
        .map(|grid| StepError {
            step: grid.step,
            error: (grid.value - exact) / scale,
            round_off: Some((grid.round_off + 0.5 * f64::EPSILON * exact.abs()) / scale),
        })
        .collect();
    judged.rule = "least squares of ln|error| on ln dt";
    let fit = match fit_at_level(&points, AUDIT_LEVEL) {
        Ok(fit) => fit,
        Err(error) => {
            judged.reason = error.to_string();
            return None;
        }
    };
    for (point, fitted) in judged.points.iter_mut().zip(&fit.points) {
        point.error = Some(fitted.error.abs());
        point.used = fitted.used;
        point.excluded = fitted.excluded;
    }
    judged.class = fit.class;
    judged.reason.clone_from(&fit.reason);
    // The verdict of the fit agrees with `against_formal`; only its line is needed here.
    debug_assert!(
        judged.formal_order.is_none_or(|order| fit.verdict(order) != OrderVerdict::Pass || fit.line.is_some())
    );
    fit.line.map(|line| Observed {
        order: line.order,
        interval: line.interval95,
        band: line.verdict_band,
        constant: line.error_constant,
    })
}

/// Takes order and limit from the values themselves.
fn against_limit(judged: &mut QuantityAudit, own: &super::grid_convergence::SelfConvergence) -> Option<Observed> {
    judged.rule = own.rule;
    judged.class = own.behaviour.class();
    judged.reason.clone_from(&own.reason);
    let converges = own.behaviour == Behaviour::MonotoneConverging;
    let scale = if own.limit == 0.0 { 1.0 } else { own.limit.abs() };
    for point in &mut judged.points {
        point.used = own.behaviour != Behaviour::Constant;
        point.error = converges.then_some((point.value - own.limit).abs() / scale);
    }
    (own.behaviour != Behaviour::Constant).then_some(Observed {
        order: own.order,
        interval: own.interval95,
        band: own.verdict_band,
        constant: own.error_constant.abs() / scale,
    })
}

/// Adds the error bars of the finest value: for columns that converge only, for a bar of a diverging one is none.
fn add_bands(judged: &mut QuantityAudit, grids: &[GridValue], least_squares: EcaHoekstra, formal: Option<f64>) {
    let apart = |from: &GridValue| grids.iter().copied().find(|grid| grid.step >= RATIO_MIN * from.step);
    let second = apart(&grids[0]);
    judged.three_grids =
        second.and_then(|second| Some([grids[0], second, apart(&second)?])).and_then(|three| three_grids(three).ok());
    if judged.class == Class::Converging {
        judged.error_bands.extend(judged.three_grids.and_then(|three| three.uncertainty));
        if let (Some(coarse), Some(observed)) = (second, judged.observed_order) {
            judged.error_bands.extend(roache(grids[0], coarse, Some(observed), formal));
            judged.error_bands.extend(formal.and_then(|formal| xing_stern(grids[0], coarse, observed, formal)));
        }
        judged.error_bands.extend(least_squares.uncertainty);
    }
    judged.least_squares = Some(least_squares);
}
