//! Tables in Parquet, a bounded number of rows at a time.
//!
//! The columns are those of the CSV tables, by the same names. Numbers are DOUBLE, so every bit survives; an empty cell
//! of CSV is null. A table that comes in may have FLOAT and integer columns and row groups of any size, uncompressed or
//! compressed by Snappy; other compressions need a C library and are refused by name. Tables that go out are not
//! compressed: digits of solutions have no pattern to find.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use ::parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{ColumnDescriptor, ColumnPath, Type};

use super::error::{At, Fault, Place, TableError};
use super::{Cells, Format, Kind, Layout, Rows};
use crate::text::shortened;

/// Rows of a row group that is written: some megabytes.
const ROW_GROUP: usize = 1 << 16;

/// How older writers mark integers without a sign, and those with one; newer ones say it both ways.
const UNSIGNED: [ConvertedType; 4] =
    [ConvertedType::UINT_8, ConvertedType::UINT_16, ConvertedType::UINT_32, ConvertedType::UINT_64];
const SIGNED: [ConvertedType; 4] =
    [ConvertedType::INT_8, ConvertedType::INT_16, ConvertedType::INT_32, ConvertedType::INT_64];

/// What the library makes of a file, damaged ones included: its panics become errors.
///
/// Nothing that a panic may have left half done is looked at again: the table is refused.
fn guarded<R>(work: impl FnOnce() -> Result<R, ParquetError>) -> Result<R, ParquetError> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(ParquetError::General("the file is damaged".to_owned())))
}

/// A Parquet table that is being read.
pub struct ParquetReader {
    file: String,
    reader: SerializedFileReader<File>,
    layout: Arc<Layout>,
    format: &'static Format,
    /// Which columns hold integers without a sign, in the order of the format, those that are kept behind them.
    unsigned: Vec<bool>,
    /// The row group that is read next.
    group: usize,
    /// Columns of the present row group, in the same order.
    columns: Vec<Option<ColumnReader>>,
    /// Rows left in the present row group.
    left: usize,
    /// Rows handed out.
    rows: u64,
}

impl ParquetReader {
    /// Reads what `input` says of itself; `file` is its name in messages.
    ///
    /// # Errors
    /// [`TableError`] for a file that is no Parquet table, or whose columns are not those of `format`.
    pub fn new(file: &str, input: File, format: &'static Format) -> Result<Self, Box<TableError>> {
        let refuse = |fault| TableError::new(Place { file: file.to_owned(), ..Place::default() }, fault, format);
        let reader = guarded(|| SerializedFileReader::new(input)).map_err(|error| refuse(unsound(&error)))?;
        let metadata = reader.metadata();
        let schema = metadata.file_metadata().schema_descr_ptr();
        let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        // A file without lines: its columns have numbers all the same.
        let mut layout = Layout::new(&names, file, At::Table, format)?;
        for kept in &mut layout.kept {
            let is_text = schema.column(kept.place).physical_type() == Physical::BYTE_ARRAY;
            kept.kind = if is_text { Kind::Text } else { Kind::Number };
        }
        let known =
            format.columns.iter().zip(&layout.places).map(|(known, place)| (known.name.into(), known.kind, *place));
        let kept = layout.kept.iter().map(|kept| (kept.name.clone().into(), kept.kind, Some(kept.place)));
        let all: Vec<(Cow<'static, str>, Kind, Option<usize>)> = known.chain(kept).collect();
        let mut unsigned = vec![false; all.len()];
        for ((name, kind, place), unsigned) in all.into_iter().zip(&mut unsigned) {
            let Some(place) = place else { continue };
            let column = schema.column(place);
            check_type(name, kind, &column).map_err(refuse)?;
            *unsigned = UNSIGNED.contains(&column.converted_type())
                || matches!(column.logical_type_ref(), Some(LogicalType::Integer(kind)) if !kind.is_signed);
            for chunk in metadata.row_groups().iter().filter_map(|group| group.columns().get(place)) {
                let found = chunk.compression();
                if !matches!(found, Compression::UNCOMPRESSED | Compression::SNAPPY) {
                    let name = format!("{found:?}");
                    return Err(refuse(Fault::Compressed(name.split('(').next().unwrap_or_default().to_owned())));
                }
            }
        }
        let (file, layout) = (file.to_owned(), Arc::new(layout));
        Ok(Self { file, reader, layout, format, unsigned, group: 0, columns: Vec::new(), left: 0, rows: 0 })
    }

    /// The layout that its columns have.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Rows of the whole table.
    pub fn rows(&self) -> u64 {
        u64::try_from(self.reader.metadata().file_metadata().num_rows()).unwrap_or(0)
    }

    /// At most `count` rows, none at the end.
    ///
    /// # Errors
    /// [`TableError`] for a table that cannot be read on.
    pub fn next_rows(&mut self, count: usize) -> Result<Rows, Box<TableError>> {
        guarded(|| self.read(count)).map_err(|error| {
            TableError::new(Place { file: self.file.clone(), ..Place::default() }, unsound(&error), self.format)
        })
    }

    /// Leaves out the next `count` rows, whole row groups unread.
    ///
    /// # Errors
    /// As [`ParquetReader::next_rows`].
    pub fn skip(&mut self, mut count: u64) -> Result<(), Box<TableError>> {
        // Ends with the list of row groups, or with the count.
        while let Some(group) = self.reader.metadata().row_groups().get(self.group).filter(|_| self.left == 0) {
            let rows = u64::try_from(group.num_rows()).unwrap_or(0);
            if rows > count {
                break;
            }
            (self.group, self.rows, count) = (self.group + 1, self.rows + rows, count - rows);
        }
        while count > 0 {
            let some = self.next_rows(count.min(1 << 16) as usize)?.len() as u64;
            count = if some == 0 { 0 } else { count - some };
        }
        Ok(())
    }

    fn read(&mut self, count: usize) -> Result<Rows, ParquetError> {
        let kinds = self.format.columns.iter().map(|column| column.kind);
        let mut cells: Vec<_> = kinds.chain(self.layout.kept.iter().map(|kept| kept.kind)).map(Cells::empty).collect();
        let known = self.format.columns.len();
        let mut read = 0;
        while read < count {
            if self.left == 0 && !self.next_group()? {
                break;
            }
            let part = self.left.min(count - read);
            for (index, (reader, cells)) in self.columns.iter_mut().zip(&mut cells).enumerate() {
                match (reader, cells) {
                    (Some(reader), Cells::Numbers(numbers)) => {
                        let had = numbers.len();
                        read_numbers(reader, self.unsigned[index], part, numbers)?;
                        if index >= known && is_integer(reader) {
                            check_integers(&numbers[had..], &self.layout.kept[index - known].name)?;
                        }
                    }
                    (Some(reader), Cells::Texts(texts)) => read_texts(reader, part, texts, index >= known)?,
                    _ => {}
                }
            }
            self.left -= part;
            read += part;
        }
        let first = self.rows + 1;
        self.rows += read as u64;
        Ok(Rows::of_columns(&self.layout, cells, first))
    }

    /// Opens the next row group; false at the end.
    fn next_group(&mut self) -> Result<bool, ParquetError> {
        let metadata = self.reader.metadata();
        // Ends with the list of row groups.
        while let Some(found) = metadata.row_groups().get(self.group) {
            let group = self.reader.get_row_group(self.group)?;
            self.group += 1;
            self.left = usize::try_from(found.num_rows())
                .map_err(|_| ParquetError::General("a row group has fewer than no rows".to_owned()))?;
            if self.left > 0 {
                let open = |at: &Option<usize>| at.map(|at| group.get_column_reader(at)).transpose();
                let kept = self.layout.kept.iter().map(|kept| Some(kept.place)).collect::<Vec<_>>();
                self.columns = self.layout.places.iter().chain(&kept).map(open).collect::<Result<_, _>>()?;
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn unsound(error: &ParquetError) -> Fault {
    Fault::Unreadable(format!("not a sound Parquet table: {error}"))
}

/// Refuses a column `name` whose type is not of `kind`.
fn check_type(name: Cow<'static, str>, kind: Kind, column: &ColumnDescriptor) -> Result<(), Fault> {
    let (logical, converted) = (column.logical_type_ref(), column.converted_type());
    let is_plain = logical.is_none() && converted == ConvertedType::NONE;
    let is_integer = is_plain
        || matches!(logical, Some(LogicalType::Integer(_)))
        || (logical.is_none() && (UNSIGNED.contains(&converted) || SIGNED.contains(&converted)));
    let is_text = is_plain || converted == ConvertedType::UTF8;
    let wants_text = kind == Kind::Text;
    // A part of another column is null with it.
    let fits = column.max_rep_level() == 0
        && column.max_def_level() <= 1
        // A column that was written without a value has no type.
        && (logical == Some(&LogicalType::Unknown)
            || match column.physical_type() {
                Physical::BYTE_ARRAY => wants_text && is_text,
                Physical::DOUBLE | Physical::FLOAT => !wants_text && is_plain,
                Physical::INT32 | Physical::INT64 => !wants_text && is_integer,
                _ => false,
            });
    if fits {
        return Ok(());
    }
    let found = match (column.max_rep_level(), logical) {
        (1.., _) => "lists".to_owned(),
        _ if column.max_def_level() > 1 => "parts of another column".to_owned(),
        (_, Some(logical)) => format!("{} ({logical:?})", column.physical_type()),
        (_, None) if converted == ConvertedType::NONE => column.physical_type().to_string(),
        (_, None) => format!("{} ({converted})", column.physical_type()),
    };
    Err(Fault::WrongType { name, found, expected: if wants_text { "text" } else { "numbers" } })
}

/// Appends `count` cells of `reader` to `cells`.
fn read_cells<T: DataType, U>(
    reader: &mut ColumnReaderImpl<T>,
    count: usize,
    cells: &mut Vec<Option<U>>,
    cell: impl Fn(T::T) -> U,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let (records, present, _) = reader.read_records(count, Some(&mut levels), None, &mut values)?;
    if records != count {
        return Err(ParquetError::General("a column ends before its row group".to_owned()));
    }
    let mut values = values.into_iter().map(cell);
    if present == count {
        cells.extend(values.map(Some));
    } else {
        cells.extend(levels.into_iter().map(|level| if level > 0 { values.next() } else { None }));
    }
    Ok(())
}

fn read_numbers(
    reader: &mut ColumnReader,
    unsigned: bool,
    count: usize,
    cells: &mut Vec<Option<f64>>,
) -> Result<(), ParquetError> {
    match reader {
        ColumnReader::DoubleColumnReader(reader) => read_cells(reader, count, cells, |value| value),
        ColumnReader::FloatColumnReader(reader) => read_cells(reader, count, cells, f64::from),
        ColumnReader::Int32ColumnReader(reader) if unsigned => {
            read_cells(reader, count, cells, |value| f64::from(value.cast_unsigned()))
        }
        ColumnReader::Int32ColumnReader(reader) => read_cells(reader, count, cells, f64::from),
        ColumnReader::Int64ColumnReader(reader) if unsigned => {
            read_cells(reader, count, cells, |value| value.cast_unsigned() as f64)
        }
        ColumnReader::Int64ColumnReader(reader) => read_cells(reader, count, cells, |value| value as f64),
        _ => Err(ParquetError::General("a column changes its type".to_owned())),
    }
}

fn is_integer(reader: &ColumnReader) -> bool {
    matches!(reader, ColumnReader::Int64ColumnReader(_))
}

/// Refuses integers that a number of 64 bits would round: a label that is kept must stay the same.
fn check_integers(cells: &[Option<f64>], name: &str) -> Result<(), ParquetError> {
    const EXACT: f64 = (1_u64 << 53) as f64;
    if cells.iter().flatten().any(|value| value.abs() >= EXACT) {
        return Err(ParquetError::General(format!("the column `{name}` holds integers beyond 2^53; leave it out")));
    }
    Ok(())
}

/// Appends texts: as they stand where they are kept, else no longer than a message quotes, for a cell may be of any size.
fn read_texts(
    reader: &mut ColumnReader,
    count: usize,
    cells: &mut Vec<Option<String>>,
    is_kept: bool,
) -> Result<(), ParquetError> {
    match reader {
        ColumnReader::ByteArrayColumnReader(reader) => read_cells(reader, count, cells, |value: ByteArray| {
            let text = String::from_utf8_lossy(value.data());
            if is_kept { text.into_owned() } else { shortened(&text) }
        }),
        // A column without a value.
        ColumnReader::Int32ColumnReader(reader) => read_cells(reader, count, cells, |value| value.to_string()),
        _ => Err(ParquetError::General("a column changes its type".to_owned())),
    }
}

/// A Parquet table that is being written.
pub struct ParquetWriter<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    /// Cells that do not fill a row group yet.
    waiting: Vec<Cells>,
}

impl<W: Write + Send> ParquetWriter<W> {
    /// A table with `columns`, each with its name.
    ///
    /// # Errors
    /// When `output` cannot be written.
    pub fn new(output: W, columns: &[(&str, Kind)]) -> io::Result<Self> {
        let fields = columns.iter().map(|(name, kind)| {
            let (physical, repetition, logical) = match kind {
                Kind::Count => (Physical::INT64, Repetition::REQUIRED, None),
                Kind::Number => (Physical::DOUBLE, Repetition::OPTIONAL, None),
                Kind::Text => (Physical::BYTE_ARRAY, Repetition::OPTIONAL, Some(LogicalType::String)),
            };
            let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
            field.with_logical_type(logical).build().map(Arc::new)
        });
        let fields = fields.collect::<Result<_, _>>().map_err(io::Error::other)?;
        let schema = Type::group_type_builder("penetrode").with_fields(fields).build().map_err(io::Error::other)?;
        let mut properties = WriterProperties::builder()
            .set_created_by(concat!("penetrode ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true);
        for (name, kind) in columns {
            // Numbers hardly repeat, texts do.
            let path = ColumnPath::from(vec![(*name).to_owned()]);
            properties = properties.set_column_dictionary_enabled(path, *kind == Kind::Text);
        }
        let writer = SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties.build()))
            .map_err(io::Error::from)?;
        Ok(Self { writer, waiting: columns.iter().map(|(_, kind)| Cells::empty(*kind)).collect() })
    }

    /// Adds rows: one entry a column, of the kind of the column and all of one length.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn push(&mut self, columns: Vec<Cells>) -> io::Result<()> {
        for (waiting, cells) in self.waiting.iter_mut().zip(columns) {
            waiting.append(cells);
        }
        if self.waiting.first().map_or(0, Cells::len) >= ROW_GROUP { self.flush() } else { Ok(()) }
    }

    /// Writes what waits as a row group.
    fn flush(&mut self) -> io::Result<()> {
        if self.waiting.first().map_or(0, Cells::len) == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for cells in &mut self.waiting {
            let Some(mut column) = group.next_column()? else { break };
            match cells {
                Cells::Counts(counts) => {
                    let values: Vec<i64> = counts.drain(..).map(|count| count as i64).collect();
                    column.typed::<Int64Type>().write_batch(&values, None, None)?;
                }
                Cells::Numbers(numbers) => write_cells::<DoubleType, _>(&mut column, numbers, |value| value)?,
                Cells::Texts(texts) => {
                    write_cells::<ByteArrayType, _>(&mut column, texts, |text| ByteArray::from(text.into_bytes()))?;
                }
            }
            column.close()?;
        }
        group.close()?;
        Ok(())
    }

    /// Writes the rest and the footer, and gives the output back.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        Ok(self.writer.into_inner()?)
    }
}

fn write_cells<T: DataType, U>(
    column: &mut SerializedColumnWriter<'_>,
    cells: &mut Vec<Option<U>>,
    value: impl Fn(U) -> T::T,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.drain(..).flatten().map(value).collect();
    column.typed::<T>().write_batch(&values, Some(&levels), None).map(|_| ())
}
