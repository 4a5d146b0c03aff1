//! `penetrode batch`: many scenes from a table, one line of results each, in bounded memory.

use std::fs::{self, File};
use std::io::ErrorKind::BrokenPipe;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use tempfile::NamedTempFile;

use super::method_args::MethodArgs;
#[cfg(feature = "parquet")]
use super::output::is_parquet;
use super::output::{check_format, check_outputs, is_standard, persist, tell, temporary_beside, unless_closed};
use super::{CliError, Exit};
use crate::integrators::Method;
use crate::studies::batch::csv::{CsvScenes, Records};
use crate::studies::batch::{PART, Rows, TableError, Tally, result_header, result_lines};
use crate::studies::table_text::counted;
#[cfg(feature = "parquet")]
use crate::studies::{
    batch::{RESULT_COLUMNS, result_columns},
    columns::Cells,
    parquet::{ParquetScenes, ParquetTable},
};

/// Progress over a known number of rows.
const ROWS_BAR: &str = "{bar:30} {human_pos}/{human_len} rows, {eta} left";

/// Rows read, flown and written at a time: three such chunks are the bound of the memory.
const CHUNK: usize = 128 * PART;

/// Arguments of `batch`.
#[derive(Args, Debug)]
pub struct BatchArgs {
    /// Scenes: a .csv or .parquet table, - for standard input (CSV), or random:N[:SEED] for N random scenes.
    pub scenes: PathBuf,
    /// Results: a .csv or .parquet table, written whole or not at all; - for standard output (CSV).
    #[arg(long, value_name = "RESULTS.csv")]
    pub out: PathBuf,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Also the critical velocity of every scene with a thickness.
    #[arg(long)]
    pub critical: bool,
    /// Threads [default: one a processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

impl BatchArgs {
    /// Flies every row and writes the results in the same order.
    ///
    /// # Errors
    /// A table or options that cannot be used (exit 2), results that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        check_format(&self.scenes)?;
        check_format(&self.out)?;
        check_outputs(&[("the scenes", &self.scenes)], &[("the results", &self.out)])?;
        let method = self.method.build()?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.map_or(0, usize::from))
            .build()
            .map_err(|error| CliError::Run { message: error.to_string(), help: String::new(), last: None })?;
        let progress = ProgressBar::no_length();
        let mut source = Source::open(&self.scenes, &progress)?;
        // A table that cannot be read leaves standard output empty, unless it ends badly far behind its beginning.
        let rows = source.next_rows(None)?;
        let mut sink = Sink::create(&self.out).map_err(|cause| self.unwritable(cause))?;
        let tally = match pool.install(|| self.fly_all(rows, &mut source, &mut sink, &method)) {
            // Whoever reads the results (`| head`) has enough.
            Err(CliError::Write { cause, .. }) if is_standard(&self.out) && cause.kind() == BrokenPipe => {
                return Ok(Exit::Success);
            }
            other => other?,
        };
        sink.finish(&self.out).map_err(|cause| self.unwritable(cause))?;
        progress.finish_and_clear();
        tell("", &summary(&tally));
        Ok(if tally.bad > 0 { Exit::Criterion } else { Exit::Success })
    }

    /// Flies one chunk, `rows` to begin with, while the one before is written and the next is read.
    fn fly_all(
        &self,
        mut rows: Rows,
        source: &mut Source,
        sink: &mut Sink,
        method: &Method,
    ) -> Result<Tally, CliError> {
        keep_freed_memory();
        let mut tally = Tally::default();
        let format = sink.format();
        let mut flown = Flown::default();
        let mut used = None;
        // Ends with the table: each turn reads rows, or is the last but one.
        while !rows.is_empty() || !flown.results.is_empty() {
            let first = tally.rows + flown.tally.rows + 1;
            let results = std::mem::take(&mut flown.results);
            let (next_flown, moved) = rayon::join(
                || Flown::new(&rows, first, method, self.critical, format),
                || -> Result<_, CliError> {
                    sink.write(results).map_err(|cause| self.unwritable(cause))?;
                    // After the last row nothing is left to read.
                    if rows.is_empty() { Ok(None) } else { source.next_rows(used.take()).map(Some) }
                },
            );
            tally += flown.tally;
            flown = next_flown;
            let read = moved?.unwrap_or(Rows::Random { seed: 0, rows: 0..0 });
            used = Some(std::mem::replace(&mut rows, read));
        }
        Ok(tally)
    }

    fn unwritable(&self, cause: io::Error) -> CliError {
        if is_standard(&self.out) { CliError::stdout(cause) } else { CliError::write(&self.out, cause) }
    }
}

/// Lets the allocator of glibc keep what is freed: it gives memory back above a bound that follows the largest block
/// freed so far, and buffers of a chunk, handed back and fetched anew, cost two threads a tenth of their time.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(16 << 20)));
}

fn summary(tally: &Tally) -> String {
    if tally.rows == 0 {
        return "0 rows: the table has a first line with names and no scene below it".to_owned();
    }
    let mut text = format!("{}: {} bad, {} undecided", counted(tally.rows, "row"), tally.bad, tally.undecided);
    if tally.unstable > 0 {
        text.push_str(&format!(", {} with a step beyond the stability limit", tally.unstable));
    }
    text
}

/// How results are written.
#[derive(Clone, Copy)]
enum Format {
    Csv,
    #[cfg(feature = "parquet")]
    Parquet,
}

/// Results of some rows.
enum Results {
    Lines(String),
    #[cfg(feature = "parquet")]
    Columns(Vec<Cells>),
}

/// Results of a chunk, part by part.
#[derive(Default)]
struct Flown {
    tally: Tally,
    results: Vec<Results>,
}

impl Flown {
    fn new(rows: &Rows, first: u64, method: &Method, critical: bool, format: Format) -> Self {
        let count = rows.len();
        let parts: Vec<(Tally, Results)> = (0..count.div_ceil(PART))
            .into_par_iter()
            // Single parts: a thread that takes several at once keeps the others waiting at the end of the chunk.
            .with_max_len(1)
            .map(|index| {
                let from = index * PART;
                let answers = rows.answers(from..count.min(from + PART), method, critical);
                let mut tally = Tally::default();
                tally.count(&answers);
                let first = first + from as u64;
                let results = match format {
                    Format::Csv => Results::Lines(result_lines(first, &answers)),
                    #[cfg(feature = "parquet")]
                    Format::Parquet => Results::Columns(result_columns(first, &answers)),
                };
                (tally, results)
            })
            .collect();
        let mut flown = Self::default();
        for (tally, results) in parts {
            flown.tally += tally;
            flown.results.push(results);
        }
        flown
    }
}

/// Where the scenes come from.
enum Source {
    Csv(CsvScenes<Box<dyn Read + Send>>),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetScenes>, ProgressBar),
    Random {
        seed: u64,
        next: u64,
        end: u64,
        progress: ProgressBar,
    },
}

impl Source {
    fn open(path: &Path, progress: &ProgressBar) -> Result<Self, CliError> {
        let name = path.display().to_string();
        let unreadable = |cause: String| refused(&TableError::Unreadable { file: name.clone(), cause });
        if let Some((count, seed)) = random_table(path)? {
            bar(progress, count, ROWS_BAR);
            return Ok(Self::Random { seed, next: 0, end: count, progress: progress.clone() });
        }
        if is_standard(path) {
            let input: Box<dyn Read + Send> = Box::new(progress.wrap_read(io::stdin()));
            return CsvScenes::new("standard input", input).map(Self::Csv).map_err(|error| refused(&error));
        }
        let metadata = fs::metadata(path).map_err(|error| unreadable(error.to_string()))?;
        if metadata.is_dir() {
            return Err(unreadable("is a folder".to_owned()));
        }
        let file = File::open(path).map_err(|error| unreadable(error.to_string()))?;
        #[cfg(feature = "parquet")]
        if is_parquet(path) {
            let scenes = ParquetScenes::new(&name, file).map_err(|error| refused(&error))?;
            bar(progress, scenes.rows(), ROWS_BAR);
            return Ok(Self::Parquet(Box::new(scenes), progress.clone()));
        }
        // A pipe or a device has no length.
        if metadata.len() > 0 {
            bar(progress, metadata.len(), "{bar:30} {bytes}/{total_bytes}, {eta} left");
        }
        let input: Box<dyn Read + Send> = Box::new(progress.wrap_read(file));
        CsvScenes::new(&name, input).map(Self::Csv).map_err(|error| refused(&error))
    }

    /// The next chunk, empty at the end; the memory of `used` serves again.
    fn next_rows(&mut self, used: Option<Rows>) -> Result<Rows, CliError> {
        match self {
            Self::Csv(scenes) => {
                let used: Option<Records> = match used {
                    Some(Rows::Csv(records)) => Some(records),
                    _ => None,
                };
                scenes.next_rows(CHUNK, used).map(Rows::Csv).map_err(|error| refused(&error))
            }
            #[cfg(feature = "parquet")]
            Self::Parquet(scenes, progress) => {
                let columns = scenes.next_rows(CHUNK).map_err(|error| refused(&error))?;
                progress.inc(columns.len() as u64);
                Ok(Rows::Parquet(Box::new(columns)))
            }
            Self::Random { seed, next, end, progress } => {
                let from = *next;
                *next = (*end).min(from.saturating_add(CHUNK as u64));
                progress.set_position(from);
                Ok(Rows::Random { seed: *seed, rows: from..*next })
            }
        }
    }
}

/// `random:N` or `random:N:SEED`: how many scenes, and their seed (1 when not given); `None` for a file.
fn random_table(path: &Path) -> Result<Option<(u64, u64)>, CliError> {
    let Some(text) = path.to_str().and_then(|text| text.strip_prefix("random:")) else { return Ok(None) };
    let (count, seed) = text.split_once(':').unwrap_or((text, "1"));
    match (count.parse(), seed.parse()) {
        (Ok(count), Ok(seed)) if count > 0 => Ok(Some((count, seed))),
        _ => Err(CliError::usage(
            format!("random:{text}: not a number of scenes above zero and a seed"),
            "write random:1000000:7 for a million scenes of seed 7",
        )),
    }
}

/// Where the results go.
enum Sink {
    File(BufWriter<NamedTempFile>),
    Standard(BufWriter<io::Stdout>),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetTable<NamedTempFile>>),
}

impl Sink {
    fn create(path: &Path) -> io::Result<Self> {
        #[cfg(feature = "parquet")]
        if is_parquet(path) {
            let table = ParquetTable::new(temporary_beside(path)?, &RESULT_COLUMNS)?;
            return Ok(Self::Parquet(Box::new(table)));
        }
        let mut sink = if is_standard(path) {
            Self::Standard(BufWriter::with_capacity(1 << 20, io::stdout()))
        } else {
            let file = temporary_beside(path)?;
            Self::File(BufWriter::with_capacity(1 << 20, file))
        };
        sink.write(vec![Results::Lines(result_header())])?;
        Ok(sink)
    }

    fn format(&self) -> Format {
        match self {
            Self::File(_) | Self::Standard(_) => Format::Csv,
            #[cfg(feature = "parquet")]
            Self::Parquet(_) => Format::Parquet,
        }
    }

    fn write(&mut self, results: Vec<Results>) -> io::Result<()> {
        results.into_iter().try_for_each(|part| match (&mut *self, part) {
            (Self::File(writer), Results::Lines(lines)) => writer.write_all(lines.as_bytes()),
            (Self::Standard(writer), Results::Lines(lines)) => writer.write_all(lines.as_bytes()),
            #[cfg(feature = "parquet")]
            (Self::Parquet(table), Results::Columns(columns)) => table.push(columns),
            #[cfg(feature = "parquet")]
            _ => Err(io::Error::new(io::ErrorKind::InvalidInput, "results of another format")),
        })
    }

    fn finish(self, path: &Path) -> io::Result<()> {
        match self {
            Self::File(writer) => persist(writer.into_inner().map_err(io::IntoInnerError::into_error)?, path),
            Self::Standard(mut writer) => unless_closed(writer.flush()),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => persist(table.finish()?, path),
        }
    }
}

/// A table that cannot be used, as exit code 2.
fn refused(error: &TableError) -> CliError {
    CliError::usage(error.to_string(), error.help())
}

/// Gives `progress` a length and a look; it shows on a terminal only.
fn bar(progress: &ProgressBar, length: u64, template: &str) {
    progress.set_length(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        progress.set_style(style);
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    #[test]
    fn a_random_table_has_a_length_and_a_seed() {
        assert_eq!(random_table(Path::new("random:1000:7")).unwrap(), Some((1000, 7)));
        assert_eq!(random_table(Path::new("random:1000")).unwrap(), Some((1000, 1)));
        assert_eq!(random_table(Path::new("scenes.csv")).unwrap(), None);
        for text in ["random:many", "random:0", "random:1:x"] {
            assert_eq!(random_table(Path::new(text)).unwrap_err().exit(), Exit::Usage);
        }
    }
}
