//! `penetrode batch`: many scenes from a table, one line of results each, in bounded memory.

use std::io::ErrorKind::BrokenPipe;
use std::io::{self, BufWriter, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use indicatif::ProgressBar;
use rayon::prelude::*;

use super::method_args::MethodArgs;
use super::output::{Destination, check_format, check_outputs, is_parquet, new_progress, say, show_progress};
use super::{CliError, Exit, Run};
use crate::exchange::input::{is_standard, name_of};
use crate::exchange::interruption::whole;
#[cfg(feature = "parquet")]
use crate::exchange::tables::parquet::ParquetReader;
use crate::exchange::tables::{self, Block, CsvTable, Rows, TableWriter};
use crate::integrators::Method;
use crate::physics::Scene;
use crate::studies::batch::{PART, RESULT_COLUMNS, SCENES, Scenes, Tally, Varied, answers};
use crate::text::count;

/// Progress over a known number of rows.
const ROWS_BAR: &str = "{bar:30} {human_pos}/{human_len} rows, {eta} left";

/// Rows read, solved and written at a time: three such chunks bound the memory.
const CHUNK: usize = 128 * PART;

/// Arguments of `batch`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode batch scenes.csv --out results.csv --critical")]
pub struct BatchArgs {
    /// Table of scenes, - for standard input, or random:N for N random ones.
    ///
    /// A .csv or .parquet table; standard input is CSV. random:N:SEED has another seed than 1.
    pub scenes: PathBuf,
    /// Table of results; - for standard output.
    ///
    /// A .csv or .parquet table, written whole or not at all; standard output is CSV.
    #[arg(long, value_name = "RESULTS.csv")]
    pub out: PathBuf,
    /// Scene of which each row varies numbers: columns are paths, such as parameters.P or impact.velocity, in SI units.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
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

impl Run for BatchArgs {
    fn run(&self) -> Result<Exit, CliError> {
        check_format(&self.scenes)?;
        check_format(&self.out)?;
        let scene = self.scene.as_ref().map(|path| ("the scene", path.as_path()));
        let inputs: Vec<_> = [("the scenes", self.scenes.as_path())].into_iter().chain(scene).collect();
        check_outputs(&inputs, &[("the results", &self.out)])?;
        let method = self.method.build()?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.map_or(0, usize::from))
            .build()
            .map_err(|error| CliError::failed(error.to_string(), ""))?;
        let progress = new_progress();
        let varied = self.scene.as_deref().map(|path| Scene::read(path).map(Varied::new)).transpose()?.map(Arc::new);
        let mut source = Source::open(&self.scenes, varied, &progress)?;
        // A table that cannot be read leaves standard output empty, unless it ends badly far behind its beginning.
        let first = source.next_scenes(None)?;
        let unwritable = |cause| CliError::write(&self.out, cause);
        let mut sink = self.sink().map_err(unwritable)?;
        let tally = match pool.install(|| self.solve_all(first, &mut source, &mut sink, &method)) {
            // Whoever reads the results (`| head`) has enough.
            Err(CliError::Write { cause, .. }) if is_standard(&self.out) && cause.kind() == BrokenPipe => {
                return Ok(Exit::Success);
            }
            other => other?,
        };
        let written = sink.finish().and_then(|output| Ok(output.into_inner()?));
        written.and_then(|output| whole(|| output.finish(&self.out))).map_err(unwritable)?;
        progress.finish_and_clear();
        say("", &summary(&tally));
        Ok(if tally.bad > 0 { Exit::Criterion } else { Exit::Success })
    }
}

/// Where the results go.
type Sink = TableWriter<BufWriter<Destination>>;

impl BatchArgs {
    fn sink(&self) -> io::Result<Sink> {
        let output = BufWriter::with_capacity(1 << 20, Destination::open(&self.out)?);
        TableWriter::new(output, &RESULT_COLUMNS, is_parquet(&self.out))
    }

    /// Solves one chunk, `scenes` to begin with, while the one before is written and the next is read.
    fn solve_all(
        &self,
        mut scenes: Option<Scenes>,
        source: &mut Source,
        sink: &mut Sink,
        method: &Method,
    ) -> Result<Tally, CliError> {
        keep_freed_memory();
        let is_parquet = is_parquet(&self.out);
        let mut tally = Tally::default();
        let (mut results, mut used) = (Vec::new(), None);
        // Ends with the table: each turn but the last has scenes.
        while scenes.is_some() || !results.is_empty() {
            let (solved, moved) = rayon::join(
                || scenes.as_ref().map(|scenes| solve(scenes, tally.rows + 1, method, self.critical, is_parquet)),
                || -> Result<_, CliError> {
                    let written = results.into_iter().try_for_each(|block| sink.push(block));
                    written.map_err(|cause| CliError::write(&self.out, cause))?;
                    // After the last row nothing is left to read.
                    if scenes.is_some() { source.next_scenes(used.take()) } else { Ok(None) }
                },
            );
            let (counted, written_next) = solved.unwrap_or_default();
            tally += counted;
            results = written_next;
            used = std::mem::replace(&mut scenes, moved?);
        }
        Ok(tally)
    }
}

/// Makes the allocator of glibc hold freed memory. It returns memory to the system above a bound that follows the
/// largest block freed so far, and fetching the buffers of each chunk anew costs two threads a tenth of their time.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(16 << 20)));
}

fn summary(tally: &Tally) -> String {
    if tally.rows == 0 {
        return "0 rows: the table has a first line with names and no scene below it".to_owned();
    }
    let mut text = format!("{}: {} bad, {} undecided", count(tally.rows, "row"), tally.bad, tally.undecided);
    if tally.unstable > 0 {
        text.push_str(&format!(", {} with a step beyond the stability limit", tally.unstable));
    }
    text
}

/// Results of a chunk, part by part; `first` is the number of its first row.
fn solve(scenes: &Scenes, first: u64, method: &Method, critical: bool, is_parquet: bool) -> (Tally, Vec<Block>) {
    let total = scenes.len();
    let (tallies, blocks): (Vec<Tally>, Vec<Block>) = (0..total.div_ceil(PART))
        .into_par_iter()
        // Single parts: a thread that takes several at once keeps the others waiting at the end of the chunk.
        .with_max_len(1)
        .map(|index| {
            let from = index * PART;
            let answers = answers(scenes.scenes(from..total.min(from + PART)), method, critical);
            (Tally::of(&answers), scenes.results(from, first + from as u64, &answers, is_parquet))
        })
        .unzip();
    let mut tally = Tally::default();
    for counted in tallies {
        tally += counted;
    }
    (tally, blocks)
}

/// Where the scenes come from.
enum Source {
    Csv(CsvTable<Box<dyn Read + Send>>, Option<Arc<Varied>>),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetReader>, ProgressBar, Option<Arc<Varied>>),
    Random {
        seed: u64,
        next: u64,
        end: u64,
        progress: ProgressBar,
    },
}

impl Source {
    fn open(path: &Path, varied: Option<Arc<Varied>>, progress: &ProgressBar) -> Result<Self, CliError> {
        let format = varied.as_ref().map_or(&SCENES, |varied| varied.format());
        if let Some((count, seed)) = random_table(path)? {
            if varied.is_some() {
                let help = "give a table whose columns are paths, such as impact.velocity";
                return Err(CliError::usage("random scenes vary no scene of a file", help));
            }
            show_progress(progress, count, ROWS_BAR);
            return Ok(Self::Random { seed, next: 0, end: count, progress: progress.clone() });
        }
        let name = name_of(path);
        let input: Box<dyn Read + Send> = match tables::open(path, format)? {
            None => Box::new(progress.wrap_read(io::stdin())),
            #[cfg(feature = "parquet")]
            Some(file) if is_parquet(path) => {
                let table = ParquetReader::new(&name, file, format)?;
                show_progress(progress, table.rows(), ROWS_BAR);
                return Ok(Self::Parquet(Box::new(table), progress.clone(), varied));
            }
            Some(file) => {
                // A pipe or a device has no length.
                if let Some(length) = file.metadata().ok().map(|metadata| metadata.len()).filter(|length| *length > 0) {
                    show_progress(progress, length, "{bar:30} {bytes}/{total_bytes}, {eta} left");
                }
                Box::new(progress.wrap_read(file))
            }
        };
        Ok(Self::Csv(CsvTable::new(&name, input, format)?, varied))
    }

    /// The next chunk, `None` at the end; the memory of `used` is reused.
    fn next_scenes(&mut self, used: Option<Scenes>) -> Result<Option<Scenes>, CliError> {
        let scenes = match self {
            Self::Csv(table, varied) => {
                let used = match used {
                    Some(Scenes::Table(rows) | Scenes::Varied(rows, _)) => Some(rows),
                    _ => None,
                };
                of_rows(table.next_rows(CHUNK, used)?, varied.as_ref())
            }
            #[cfg(feature = "parquet")]
            Self::Parquet(table, progress, varied) => {
                let rows = table.next_rows(CHUNK)?;
                progress.inc(rows.len() as u64);
                of_rows(rows, varied.as_ref())
            }
            Self::Random { seed, next, end, progress } => {
                let from = *next;
                *next = (*end).min(from.saturating_add(CHUNK as u64));
                progress.set_position(from);
                Scenes::Random { seed: *seed, rows: from..*next }
            }
        };
        Ok(Some(scenes).filter(|scenes| !scenes.is_empty()))
    }
}

/// Scenes that are rows, or that rows vary.
fn of_rows(rows: Rows, varied: Option<&Arc<Varied>>) -> Scenes {
    match varied {
        Some(varied) => Scenes::Varied(rows, Arc::clone(varied)),
        None => Scenes::Table(rows),
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
