//! Tables in memory: columns of numbers in by Arrow or numpy, answers out by Arrow.
//!
//! Rows go through `penetrode::studies::batch`, as those of the command do.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{
    Array, ArrayRef, ArrowPrimitiveType, Float64Array, NullArray, RecordBatch, RecordBatchIterator, RecordBatchReader,
    StringArray, UInt64Array,
};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use numpy::{PyArray1, PyReadonlyArray1};
use penetrode::exchange::tables::{At, Block, Cells, Format, Kept, Kind, Layout, Rows};
use penetrode::integrators::Method;
use penetrode::studies::batch::{PART, RESULT_COLUMNS, SCENES, Scenes, Tally, Varied, check_kept, solve};
use penetrode::text::shortened;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList, PyMapping, PyString};
use rayon::prelude::*;

use crate::errors::{advised, option_error, table_error};
use crate::flight::Chosen;
use crate::scene::Scene;
use crate::{pool, pool_of};

/// Most parts of a piece that one thread solves before it takes the next.
const PARTS_MAX: usize = 64;

/// Pieces a thread between two looks at an interrupt.
const PIECES: usize = 4;

/// Many scenes solved, one row each, in Arrow's memory.
///
/// Anything that reads Arrow takes it without a copy (``pyarrow.table(t)``, ``polars.DataFrame(t)``, DuckDB); ``t["depth_m"]``
/// is a numpy array.
///
/// Attributes
/// ----------
/// columns : list of str
///     ``row, outcome, depth_m, time_s, velocity_m_s, crater_end_time_s, crater_end_velocity_m_s, exit_margin,
///     critical_velocity_m_s, X_over_d_eq11_12, error``, in SI units; then the other columns of the scenes, as they came.
/// bad, undecided, unstable : int
///     Rows without an answer; with an undecided outcome; solved with a step beyond the stability limit.
#[pyclass(frozen, module = "penetrode")]
pub struct Table {
    schema: SchemaRef,
    batches: Vec<RecordBatch>,
    tally: Tally,
}

/// Solves many scenes, one a row.
///
/// Parameters
/// ----------
/// table : object
///     With the columns ``mass_kg, diameter_m, nose_factor, strength_pa, density_kg_m3, velocity_m_s``, and any of
///     ``thickness_m, S, B, k, crater_stiffness_n_m, criterion``; a unit at the end of a name may be another (``mass_g``). A
///     pandas, polars or pyarrow table, a DuckDB relation, anything with ``__arrow_c_stream__`` or ``__dataframe__``, or a dict
///     of arrays, where one number stands for all rows. Any other column goes with its row into the answers, unread.
/// method : str, default "taylor"
///     And ``rtol``, ``dt``, ``velocity``, ``events``, as in `solve`.
/// critical : bool, default False
///     Also the critical velocity of every scene with a thickness.
/// threads : int, optional
///     1 to 1024; by default one a processor.
/// scene : Scene, optional
///     Rows vary its numbers: columns are paths, ``parameters.A`` or ``impact.velocity``, in SI units.
///
/// Returns
/// -------
/// Table
///     One row a scene, in the same order; a row that is no scene has its reason in ``error`` and stops no other.
///
/// Raises
/// ------
/// TableError
///     A table that cannot be read: a column is missing, is likely misspelt, there twice, or holds no numbers.
/// OptionError
///     As in `solve`.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import penetrode as pn
/// >>> scenes = {"mass_kg": 2.0, "diameter_mm": 50.0, "nose_factor": 0.72, "strength_mpa": 36.0,
/// ...           "density_kg_m3": 2300.0, "velocity_m_s": np.array([200.0, 300.0])}
/// >>> pn.batch(scenes)["depth_m"].round(4).tolist()
/// [0.0975, 0.1448]
#[pyfunction]
#[pyo3(signature = (table, method="taylor", *, critical=false, threads=None, scene=None, rtol=None, dt=None, velocity=None, events=None))]
#[expect(clippy::too_many_arguments, reason = "the options of the command")]
pub fn batch(
    py: Python<'_>,
    table: &Bound<'_, PyAny>,
    method: &str,
    critical: bool,
    threads: Option<i64>,
    scene: Option<&Bound<'_, Scene>>,
    rtol: Option<f64>,
    dt: Option<&Bound<'_, PyAny>>,
    velocity: Option<&str>,
    events: Option<&str>,
) -> PyResult<Table> {
    let chosen = Chosen::new(py, method, rtol, dt, velocity, events)?;
    let method = chosen.build().map_err(|error| advised(py, "OptionError", &error))?;
    let threads = match threads {
        None => pool(py)?,
        Some(count @ 1..=1024) => Arc::new(pool_of(py, count as usize)?),
        Some(count) => return Err(option_error(py, &format!("threads = {count} is not allowed"), "from 1 to 1024")),
    };
    let varied = scene.map(|scene| Arc::new(Varied::new(scene.get().inner.scene.clone())));
    let format = varied.as_ref().map_or(&SCENES, |varied| varied.format());
    let work = Work { varied, method: &method, critical };
    let Input { layout, places, kept, mut rows } = Input::new(py, table, format)?;
    let layout = Arc::new(layout);
    let schema = schema(&kept);
    let (mut batches, mut tally) = (Vec::new(), Tally::default());
    let size = if chosen.is_plain() && !critical { PARTS_MAX * PART } else { PART };
    // Ends with the table: each turn takes rows from it.
    while let Some((count, columns)) = rows.next(py)? {
        let share = count.div_ceil(4 * threads.current_num_threads()).next_multiple_of(PART).clamp(PART, size);
        let starts: Vec<usize> = (0..count).step_by(share).collect();
        for some in starts.chunks(PIECES * threads.current_num_threads()) {
            let first = tally.rows + 1;
            let solved: Vec<(Tally, RecordBatch)> = py.detach(|| {
                threads.install(|| {
                    let piece = |&from: &usize| {
                        let to = count.min(from + share);
                        let cells = places.iter().zip(format.columns).map(|(place, known)| match place {
                            Some(place) => columns[*place].cells(from..to, known.kind),
                            None => Cells::empty(known.kind),
                        });
                        let row = first + (from - some[0]) as u64;
                        let others = kept.iter().map(|other| columns[other.place].array(from..to)).collect();
                        let rows = Rows::of_columns(&layout, cells.collect(), row);
                        work.solve(rows, to - from, row, &schema, others)
                    };
                    some.par_iter().with_max_len(1).map(piece).collect()
                })
            });
            for (counted, batch) in solved {
                tally += counted;
                batches.push(batch);
            }
            py.check_signals()?;
        }
    }
    Ok(Table { schema, batches, tally })
}

/// What is done with rows.
struct Work<'a> {
    varied: Option<Arc<Varied>>,
    method: &'a Method,
    critical: bool,
}

impl Work<'_> {
    /// The answers to `rows`, the first of which is row `first`, with their `others` behind them.
    fn solve(
        &self,
        rows: Rows,
        count: usize,
        first: u64,
        schema: &SchemaRef,
        others: Vec<ArrayRef>,
    ) -> (Tally, RecordBatch) {
        let scenes = match &self.varied {
            Some(varied) => Scenes::Varied(rows, Arc::clone(varied)),
            None => Scenes::Table(rows),
        };
        debug_assert_eq!(scenes.len(), count);
        let (tally, blocks) = solve(&scenes, first, self.method, self.critical, true);
        let mut columns: Vec<Cells> = RESULT_COLUMNS.iter().map(|(_, kind)| Cells::empty(*kind)).collect();
        for block in blocks {
            let Block::Columns(cells) = block else { unreachable!("columns were asked for") };
            columns.iter_mut().zip(cells).for_each(|(all, cells)| all.append(cells));
        }
        let arrays = columns.into_iter().map(|cells| -> ArrayRef {
            match cells {
                Cells::Counts(cells) => Arc::new(UInt64Array::from(cells)),
                Cells::Numbers(cells) => Arc::new(Float64Array::from(cells)),
                Cells::Texts(cells) => Arc::new(StringArray::from(cells)),
            }
        });
        let batch = RecordBatch::try_new(Arc::clone(schema), arrays.chain(others).collect());
        (tally, batch.unwrap_or_else(|error| unreachable!("columns of one length and of the schema: {error}")))
    }
}

/// A column of the scenes that goes unread into the answers.
struct Other {
    name: String,
    place: usize,
    kind: DataType,
}

/// The columns of the answers, and those `kept` of the scenes behind them.
fn schema(kept: &[Other]) -> SchemaRef {
    let field = |(name, kind): &(&str, Kind)| match kind {
        Kind::Count => Field::new(*name, DataType::UInt64, false),
        Kind::Number => Field::new(*name, DataType::Float64, true),
        Kind::Text => Field::new(*name, DataType::Utf8, true),
    };
    let others = kept.iter().map(|other| Field::new(&other.name, other.kind.clone(), true));
    Arc::new(Schema::new(RESULT_COLUMNS.iter().map(field).chain(others).collect::<Vec<_>>()))
}

/// A table that comes in.
struct Input<'py> {
    layout: Layout,
    /// Place in the table of each column of the format.
    places: Vec<Option<usize>>,
    kept: Vec<Other>,
    rows: Source<'py>,
}

enum Source<'py> {
    Arrow(RecordBatchStreamReader),
    /// Columns, their length, and whether they were handed out.
    Arrays(Vec<Held<'py>>, usize, bool),
}

/// A column of a dict.
enum Held<'py> {
    Numbers(PyReadonlyArray1<'py, f64>),
    Texts(Vec<Option<String>>),
    /// One value for all rows.
    Number(f64),
    Text(Option<String>),
}

/// A column of some rows.
enum Column<'a> {
    Arrow(ArrayRef),
    Numbers(&'a [f64]),
    Texts(&'a [Option<String>]),
    Number(f64),
    Text(Option<&'a str>),
}

impl<'py> Input<'py> {
    fn new(py: Python<'py>, table: &Bound<'py, PyAny>, format: &'static Format) -> PyResult<Self> {
        let source = if let Ok(columns) = table.cast::<PyMapping>() {
            return Self::of_arrays(py, columns, format);
        } else if table.hasattr("__arrow_c_stream__")? {
            stream(table)?
        } else if table.hasattr("__dataframe__")? {
            // The older protocol of tables: pyarrow reads it.
            stream(&py.import("pyarrow.interchange")?.call_method1("from_dataframe", (table,))?)?
        } else {
            let kind = table.get_type().name()?;
            let help = "give a dict of arrays, or a table of pandas, polars, pyarrow or DuckDB";
            return Err(table_error(py, &format!("a {kind} is no table"), help));
        };
        let fields = source.schema();
        let names: Vec<&str> = fields.fields().iter().map(|field| field.name().as_str()).collect();
        let kinds: Vec<DataType> = fields.fields().iter().map(|field| field.data_type().clone()).collect();
        let input = Self::with(py, &names, &kinds, format, Source::Arrow(source))?;
        for field in input.places.iter().flatten().map(|place| fields.field(*place)) {
            let kind = field.data_type();
            if !(is_text(kind) || is_number(kind)) {
                let message = format!("the column `{}` is of the type {kind}", field.name());
                return Err(table_error(py, &message, "give real numbers, or texts for the criterion"));
            }
        }
        Ok(input)
    }

    fn of_arrays(py: Python<'py>, table: &Bound<'py, PyMapping>, format: &'static Format) -> PyResult<Self> {
        let (mut names, mut held, mut rows) = (Vec::new(), Vec::new(), None);
        for pair in table.items()?.iter() {
            let (name, given): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair.extract()?;
            let name: String = name
                .extract()
                .map_err(|_| table_error(py, "a name of a column is no text", "name the columns as mass_kg"))?;
            let column = Held::new(py, &name, &given)?;
            if let Some(length) = column.len() {
                let first = rows.get_or_insert((name.clone(), length));
                if first.1 != length {
                    let message = format!("`{name}` has {length} rows, and `{}` has {}", first.0, first.1);
                    return Err(table_error(py, &message, "give columns of one length"));
                }
            }
            names.push(name);
            held.push(column);
        }
        let count = rows.map_or(1, |(_, length)| length);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let kind = |held: &Held<'_>| match held {
            Held::Text(None) => DataType::Null,
            Held::Texts(_) | Held::Text(_) => DataType::Utf8,
            Held::Numbers(_) | Held::Number(_) => DataType::Float64,
        };
        let kinds: Vec<DataType> = held.iter().map(kind).collect();
        Self::with(py, &names, &kinds, format, Source::Arrays(held, count, false))
    }

    fn with(
        py: Python<'py>,
        names: &[&str],
        kinds: &[DataType],
        format: &'static Format,
        rows: Source<'py>,
    ) -> PyResult<Self> {
        let mut layout =
            Layout::new(names, "the table", At::Table, format).map_err(|error| advised(py, "TableError", &*error))?;
        // They go into the answers as they are, and not through cells of texts.
        let kept = layout.take_kept();
        check_kept(&kept, !std::ptr::eq(format, &raw const SCENES))
            .map_err(|(message, help)| table_error(py, &message, &help))?;
        let other = |kept: Kept| Other { kind: kinds[kept.place()].clone(), place: kept.place(), name: kept.name };
        let kept = kept.into_iter().map(other).collect();
        let places = layout.places().to_vec();
        for (known, place) in format.columns.iter().zip(&places) {
            let Some(place) = *place else { continue };
            // A column without a value fits any.
            let Some(is_text) = holds_texts(&kinds[place]) else { continue };
            if is_text != (known.kind == Kind::Text) {
                let [found, wanted] = if is_text { ["texts", "numbers"] } else { ["numbers", "texts"] };
                let message = format!("the column `{}` holds {found}", names[place]);
                return Err(table_error(py, &message, &format!("give {wanted}, the unit in the name of the column")));
            }
        }
        Ok(Self { layout, places, kept, rows })
    }
}

impl Source<'_> {
    /// Some rows, and how many; `None` at the end.
    fn next(&mut self, py: Python<'_>) -> PyResult<Option<(usize, Vec<Column<'_>>)>> {
        match self {
            Self::Arrow(reader) => {
                let refuse = |error: arrow_schema::ArrowError| {
                    table_error(py, &format!("the table cannot be read on: {error}"), "look at where it comes from")
                };
                let batch = py.detach(|| reader.next()).transpose().map_err(refuse)?;
                Ok(batch.map(|batch| (batch.num_rows(), batch.columns().iter().cloned().map(Column::Arrow).collect())))
            }
            Self::Arrays(_, _, true) => Ok(None),
            Self::Arrays(held, count, is_read) => {
                *is_read = true;
                let columns = held.iter().map(|held| held.column()).collect::<PyResult<_>>()?;
                Ok(Some((*count, columns)))
            }
        }
    }
}

impl<'py> Held<'py> {
    /// The column `name` that is `given`: an array, a list, or one value for all rows.
    fn new(py: Python<'py>, name: &str, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        if given.is_none() {
            return Ok(Self::Text(None));
        }
        if let Ok(text) = given.cast::<PyString>() {
            return Ok(Self::Text(Some(text.to_str()?.to_owned())));
        }
        let refuse = |why: &str, help: &str| table_error(py, &format!("the column `{name}` {why}"), help);
        let numpy = py.import("numpy")?;
        let array = numpy
            .call_method1("asarray", (given,))
            .map_err(|error| refuse(&format!("is no array: {}", error.value(py)), "give numbers in one row"))?;
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
        match (kind.as_str(), shape.len()) {
            ("f" | "i" | "u", 0) => Ok(Self::Number(array.extract()?)),
            ("f" | "i" | "u", 1) => {
                let keywords = PyDict::new(py);
                keywords.set_item("dtype", "float64")?;
                keywords.set_item("requirements", ["C", "A"])?;
                let array = numpy.call_method("require", (array,), Some(&keywords))?;
                Ok(Self::Numbers(array.extract()?))
            }
            ("U" | "O" | "T", 1) => {
                let texts = array.try_iter()?.map(|cell| -> PyResult<_> {
                    let cell = cell?;
                    if cell.is_none() {
                        return Ok(None);
                    }
                    match cell.extract::<String>() {
                        Ok(text) => Ok(Some(text)),
                        Err(_) => Err(refuse("holds neither numbers nor texts", "give an array of floats")),
                    }
                });
                Ok(Self::Texts(texts.collect::<PyResult<_>>()?))
            }
            (_, 2..) => Err(refuse(&format!("has the shape {}", array.getattr("shape")?), "give numbers in one row")),
            _ => Err(refuse(&format!("is of the type {}", array.getattr("dtype")?), "give real numbers")),
        }
    }

    /// How many rows; `None` for one value for all.
    fn len(&self) -> Option<usize> {
        match self {
            Self::Numbers(array) => Some(array.as_array().len()),
            Self::Texts(texts) => Some(texts.len()),
            Self::Number(_) | Self::Text(_) => None,
        }
    }

    /// As a column.
    fn column(&self) -> PyResult<Column<'_>> {
        Ok(match self {
            Self::Numbers(array) => Column::Numbers(array.as_slice()?),
            Self::Texts(texts) => Column::Texts(texts),
            Self::Number(number) => Column::Number(*number),
            Self::Text(text) => Column::Text(text.as_deref()),
        })
    }
}

impl Column<'_> {
    /// The cells of `rows`, as the rows of a table of the library; a NaN is a number that is refused there.
    fn cells(&self, rows: Range<usize>, kind: Kind) -> Cells {
        match (self, kind) {
            (Self::Numbers(numbers), Kind::Number) => Cells::Numbers(numbers[rows].iter().map(|n| Some(*n)).collect()),
            (Self::Number(number), Kind::Number) => Cells::Numbers(vec![Some(*number); rows.len()]),
            (Self::Arrow(array), Kind::Number) => Cells::Numbers(numbers_of(&array.slice(rows.start, rows.len()))),
            (Self::Texts(texts), Kind::Text) => {
                Cells::Texts(texts[rows].iter().map(|text| text.as_deref().map(shortened)).collect())
            }
            (Self::Text(text), Kind::Text) => Cells::Texts(vec![text.map(shortened); rows.len()]),
            (Self::Arrow(array), Kind::Text) => Cells::Texts(texts_of(&array.slice(rows.start, rows.len()))),
            // A column without a value has no type.
            _ => Cells::empty(kind),
        }
    }

    /// The same as they are; those of Arrow without a copy.
    fn array(&self, rows: Range<usize>) -> ArrayRef {
        match self {
            Self::Arrow(array) => array.slice(rows.start, rows.len()),
            Self::Numbers(numbers) => Arc::new(Float64Array::from(numbers[rows].to_vec())),
            Self::Number(number) => Arc::new(Float64Array::from(vec![*number; rows.len()])),
            Self::Texts(texts) => Arc::new(StringArray::from(texts[rows].to_vec())),
            Self::Text(Some(text)) => Arc::new(StringArray::from(vec![*text; rows.len()])),
            Self::Text(None) => Arc::new(NullArray::new(rows.len())),
        }
    }
}

/// Whether a column of this type holds texts.
fn is_text(kind: &DataType) -> bool {
    match kind {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => true,
        DataType::Dictionary(_, values) => is_text(values),
        _ => false,
    }
}

/// Whether a column of this type holds real numbers, or nothing at all.
fn is_number(kind: &DataType) -> bool {
    kind.is_integer() || matches!(kind, DataType::Float32 | DataType::Float64 | DataType::Null)
}

/// Whether a column of this type holds texts, if it holds anything.
fn holds_texts(kind: &DataType) -> Option<bool> {
    (*kind != DataType::Null).then(|| is_text(kind))
}

/// The numbers of an array of [`is_number`].
fn numbers_of(array: &ArrayRef) -> Vec<Option<f64>> {
    fn of<T: ArrowPrimitiveType>(array: &ArrayRef, number: impl Fn(T::Native) -> f64) -> Vec<Option<f64>> {
        let array = array.as_primitive::<T>();
        match array.nulls() {
            None => array.values().iter().map(|value| Some(number(*value))).collect(),
            Some(_) => array.iter().map(|value| value.map(&number)).collect(),
        }
    }
    match array.data_type() {
        DataType::Float64 => of::<Float64Type>(array, |value| value),
        DataType::Float32 => of::<Float32Type>(array, f64::from),
        DataType::Int8 => of::<Int8Type>(array, f64::from),
        DataType::Int16 => of::<Int16Type>(array, f64::from),
        DataType::Int32 => of::<Int32Type>(array, f64::from),
        DataType::Int64 => of::<Int64Type>(array, |value| value as f64),
        DataType::UInt8 => of::<UInt8Type>(array, f64::from),
        DataType::UInt16 => of::<UInt16Type>(array, f64::from),
        DataType::UInt32 => of::<UInt32Type>(array, f64::from),
        DataType::UInt64 => of::<UInt64Type>(array, |value| value as f64),
        _ => vec![None; array.len()],
    }
}

/// The texts of an array of [`is_text`].
fn texts_of(array: &ArrayRef) -> Vec<Option<String>> {
    let owned = |text: Option<&str>| text.map(shortened);
    match array.data_type() {
        DataType::Utf8 => array.as_string::<i32>().iter().map(owned).collect(),
        DataType::LargeUtf8 => array.as_string::<i64>().iter().map(owned).collect(),
        DataType::Utf8View => array.as_string_view().iter().map(owned).collect(),
        DataType::Dictionary(..) => {
            let dictionary = array.as_any_dictionary();
            let values = texts_of(dictionary.values());
            let keys = dictionary.normalized_keys();
            (0..array.len()).map(|row| if array.is_valid(row) { values[keys[row]].clone() } else { None }).collect()
        }
        _ => vec![None; array.len()],
    }
}

#[pymethods]
impl Table {
    #[getter]
    fn columns(&self) -> Vec<&str> {
        self.schema.fields().iter().map(|field| field.name().as_str()).collect()
    }

    #[getter]
    fn bad(&self) -> u64 {
        self.tally.bad
    }

    #[getter]
    fn undecided(&self) -> u64 {
        self.tally.undecided
    }

    #[getter]
    fn unstable(&self) -> u64 {
        self.tally.unstable
    }

    fn __len__(&self) -> usize {
        self.tally.rows as usize
    }

    /// The column `name`: an array of numpy, of integers for ``row``, of objects for texts; NaN and None where there is none.
    ///
    /// Another column of the scenes that holds neither floats nor texts is pyarrow's.
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (py, table) = (slf.py(), slf.get());
        let place = table.schema.index_of(name);
        let place =
            place.map_err(|_| PyKeyError::new_err(format!("{name}; there are {}", table.columns().join(", "))))?;
        let arrays = table.batches.iter().map(|batch| batch.column(place));
        Ok(match table.schema.field(place).data_type() {
            DataType::UInt64 if place < RESULT_COLUMNS.len() => {
                let all = arrays.flat_map(|array| array.as_primitive::<UInt64Type>().values().iter().copied());
                PyArray1::from_vec(py, all.collect()).into_any()
            }
            DataType::Float64 => {
                let all = arrays.flat_map(|array| array.as_primitive::<Float64Type>().iter());
                PyArray1::from_vec(py, all.map(|number| number.unwrap_or(f64::NAN)).collect()).into_any()
            }
            DataType::Utf8 => {
                // Few words and many rows: each word is one object.
                let mut known: HashMap<&str, Bound<'py, PyAny>> = HashMap::new();
                let list = PyList::empty(py);
                for text in arrays.flat_map(|array| array.as_string::<i32>().iter()) {
                    match text {
                        None => list.append(py.None())?,
                        Some(text) => {
                            list.append(&*known.entry(text).or_insert_with(|| PyString::new(py, text).into_any()))?
                        }
                    }
                }
                let keywords = PyDict::new(py);
                keywords.set_item("dtype", "object")?;
                py.import("numpy")?.call_method("array", (list,), Some(&keywords))?
            }
            _ => Self::to_arrow(slf)?.call_method1("column", (name,))?.call_method0("to_numpy")?,
        })
    }

    /// Every column as an array of numpy.
    ///
    /// Returns
    /// -------
    /// dict of numpy.ndarray, each of shape (n,)
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(slf.py());
        for name in slf.get().columns() {
            all.set_item(name, Self::__getitem__(slf, name)?)?;
        }
        Ok(all)
    }

    /// The table as a pyarrow.Table, without a copy.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("pyarrow")?.call_method1("table", (slf,))
    }

    /// The table as a pandas.DataFrame.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        py.import("pandas")?.call_method1("DataFrame", (Self::to_dict(slf)?,))
    }

    /// The table as a polars.DataFrame, without a copy.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

    /// The table by the Arrow PyCapsule interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // What is asked for need not be had: the interface leaves that to the producer.
        let _ = requested_schema;
        let batches = self.batches.clone().into_iter().map(Ok);
        let reader = RecordBatchIterator::new(batches, Arc::clone(&self.schema));
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), c"arrow_array_stream")
    }

    fn __repr__(&self) -> String {
        let Tally { rows, bad, undecided, unstable, .. } = self.tally;
        let unstable = if unstable > 0 { format!(", {unstable} unstable") } else { String::new() };
        format!("<penetrode.Table of {rows} rows: {bad} bad, {undecided} undecided{unstable}>")
    }
}
/// The Arrow stream of `table`.
fn stream(table: &Bound<'_, PyAny>) -> PyResult<RecordBatchStreamReader> {
    let py = table.py();
    let refuse =
        |what: &str| table_error(py, &format!("the Arrow stream {what}"), "look at where the table comes from");
    let capsule = table.call_method0("__arrow_c_stream__")?;
    let capsule = capsule.cast::<PyCapsule>().map_err(|_| refuse("is no capsule"))?;
    let name = c"arrow_array_stream";
    let pointer = capsule.pointer_checked(Some(name)).map_err(|_| refuse("has another name"))?;
    // SAFETY: a capsule of this name holds an ArrowArrayStream, by the Arrow PyCapsule interface; it is moved out, and the
    // capsule left with one that is released, as that interface asks of a consumer.
    let stream = unsafe { FFI_ArrowArrayStream::from_raw(pointer.as_ptr().cast()) };
    RecordBatchStreamReader::try_new(stream).map_err(|error| refuse(&format!("cannot be read: {error}")))
}
