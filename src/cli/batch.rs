//! `penetrode batch`: many scenes from a table, one line of results each, in bounded memory.

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use csv::{ByteRecord, ReaderBuilder};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::method_args::MethodArgs;
use super::output::{persist, temporary_beside};
use super::{CliError, Exit};
use crate::studies::batch::{Layout, RESULT_HEADER, answer, is_undecided, result_line};

/// Rows read, flown and written at a time: the bound of the memory.
const CHUNK: usize = 8192;

/// Arguments of `batch`.
#[derive(Args, Debug)]
pub struct BatchArgs {
    /// Scenes: a CSV table, or - for standard input.
    pub scenes: PathBuf,
    /// Results: a CSV table, written whole or not at all.
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

/// How many rows came to what.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    rows: u64,
    bad: u64,
    undecided: u64,
}

impl BatchArgs {
    /// Flies every row and writes the results in the same order.
    ///
    /// # Errors
    /// A table or options that cannot be used (exit 2), results that cannot be written (exit 1).
    pub fn run(&self) -> Result<Exit, CliError> {
        for path in [&self.scenes, &self.out] {
            if path.extension().is_some_and(|e| e == "parquet") {
                return Err(CliError::usage(
                    format!("{}: this build reads and writes CSV only", path.display()),
                    "give a .csv file",
                ));
            }
        }
        if is_same_file(&self.scenes, &self.out) {
            return Err(CliError::usage("the results would replace the scenes", "give --out another name"));
        }
        let method = self.method.build()?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.map_or(0, usize::from))
            .build()
            .map_err(|error| CliError::Run { message: error.to_string(), help: String::new(), last: None })?;
        let (input, size) = self.open()?;
        let progress = progress_bar(size);
        let mut reader = ReaderBuilder::new().flexible(true).from_reader(progress.wrap_read(input));
        let layout = self.layout(&mut reader)?;

        let unwritable = |cause: io::Error| CliError::Write { path: self.out.display().to_string(), cause };
        let file = temporary_beside(&self.out).map_err(unwritable)?;
        let mut writer = BufWriter::with_capacity(1 << 20, file);
        writeln!(writer, "{RESULT_HEADER}").map_err(unwritable)?;
        let mut tally = Tally::default();
        let mut chunk: Vec<Result<ByteRecord, String>> = Vec::with_capacity(CHUNK);
        // Ends with the file: each turn reads rows, or is the last.
        loop {
            chunk.clear();
            for record in reader.byte_records().take(CHUNK) {
                match record {
                    Err(error) if error.is_io_error() => return Err(self.unreadable(&error.to_string())),
                    other => chunk.push(other.map_err(|error| error.to_string())),
                }
            }
            if chunk.is_empty() {
                break;
            }
            let answers: Vec<_> = pool.install(|| {
                chunk
                    .par_iter()
                    .map(|record| {
                        let scene = layout.scene(record.as_ref().map_err(Clone::clone)?)?;
                        answer(&scene, method.integrator(), self.critical)
                    })
                    .collect()
            });
            for answer in &answers {
                tally.rows += 1;
                tally.bad += u64::from(answer.is_err());
                tally.undecided += u64::from(is_undecided(answer));
                writeln!(writer, "{}", result_line(tally.rows, answer)).map_err(unwritable)?;
            }
        }
        progress.finish_and_clear();
        let file = writer.into_inner().map_err(|error| unwritable(error.into_error()))?;
        persist(file, &self.out).map_err(unwritable)?;
        eprintln!("{} rows: {} bad, {} undecided", tally.rows, tally.bad, tally.undecided);
        Ok(if tally.bad > 0 { Exit::Criterion } else { Exit::Success })
    }

    /// The table and its size [bytes]; 0 where it has none.
    fn open(&self) -> Result<(Box<dyn Read + Send>, u64), CliError> {
        if self.scenes.as_os_str() == "-" {
            return Ok((Box::new(io::stdin()), 0));
        }
        let metadata = fs::metadata(&self.scenes).map_err(|error| self.unreadable(&error.to_string()))?;
        if metadata.is_dir() {
            return Err(self.unreadable("is a folder"));
        }
        let file = File::open(&self.scenes).map_err(|error| self.unreadable(&error.to_string()))?;
        Ok((Box::new(file), metadata.len()))
    }

    fn layout<R: Read>(&self, reader: &mut csv::Reader<R>) -> Result<Layout, CliError> {
        let header = reader.headers().map_err(|error| self.unreadable(&error.to_string()))?.clone();
        if header.is_empty() {
            return Err(self.unreadable("is empty: the first line names the columns"));
        }
        Layout::new(&header).map_err(|error| {
            CliError::usage(
                format!("{}:1: {error}", self.scenes.display()),
                format!("columns: {}", crate::studies::batch::COLUMNS.join(", ")),
            )
        })
    }

    fn unreadable(&self, cause: &str) -> CliError {
        CliError::usage(format!("{}: {cause}", self.scenes.display()), "name a CSV table of scenes")
    }
}

/// Whether both paths are one file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// A bar with time left, on a terminal only.
fn progress_bar(size: u64) -> ProgressBar {
    let bar = ProgressBar::new(size);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {bytes}/{total_bytes}, {eta} left") {
        bar.set_style(style);
    }
    bar
}
