//! `penetrode batch`: many scenes from a table, one line of results each, in bounded memory.

use std::io::ErrorKind::BrokenPipe;
use std::io::{self, BufWriter, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use indicatif::ProgressBar;

use super::method_args::MethodArgs;
use super::output::{Destination, check_format, check_outputs, is_parquet, new_progress, say, show_progress};
use super::{CliError, Exit, Run};
use crate::exchange::input::{is_standard, name_of};
use crate::exchange::interruption::whole;
#[cfg(feature = "parquet")]
use crate::exchange::tables::parquet::ParquetReader;
use crate::exchange::tables::{self, CsvTable, Kept, Rows, TableWriter};
use crate::integrators::Method;
use crate::physics::Scene;
use crate::studies::batch::{PART, SCENES, Scenes, Tally, Varied, check_kept, columns_with, solve};
use crate::text::{count, shortened};

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
    /// Only this part of the scenes, such as 7/1000, for an array of jobs.
    ///
    /// Rows keep their numbers: the parts one behind the other are the whole. A CSV table is read twice to be counted.
    #[arg(long, value_name = "I/N", value_parser = part)]
    pub part: Option<Part>,
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
        let mut source = Source::open(&self.scenes, varied.clone(), &progress)?;
        let mut rows = 0..u64::MAX;
        if let Some(part) = self.part {
            rows = part.rows(source.count(&self.scenes)?, source.multiple());
            source = Source::open(&self.scenes, varied, &progress)?;
            source.skip(rows.start)?;
        }
        let mut source = Cut { source, left: rows.end - rows.start };
        let kept = source.source.kept().to_vec();
        check_kept(&kept, self.scene.is_some()).map_err(|(message, help)| CliError::usage(message, help))?;
        // A table that cannot be read leaves standard output empty, unless it ends badly far behind its beginning.
        let first = source.next_scenes(None)?;
        let unwritable = |cause| CliError::write(&self.out, cause);
        let mut sink = self.sink(&kept).map_err(unwritable)?;
        let tally = match pool.install(|| self.solve_all(first, rows.start, &mut source, &mut sink, &method)) {
            // Whoever reads the results (`| head`) has enough.
            Err(CliError::Write { cause, .. }) if is_standard(&self.out) && cause.kind() == BrokenPipe => {
                return Ok(Exit::Success);
            }
            other => other?,
        };
        let written = sink.finish().and_then(|output| Ok(output.into_inner()?));
        written.and_then(|output| whole(|| output.finish(&self.out))).map_err(unwritable)?;
        progress.finish_and_clear();
        if !kept.is_empty() {
            let names: Vec<_> = kept.iter().map(|kept| shortened(&kept.name)).collect();
            say("", &format!("passed on unread: {}", names.join(", ")));
        }
        say("", &summary(&tally, self.part));
        Ok(if tally.bad > 0 { Exit::Criterion } else { Exit::Success })
    }
}

/// Where the results go.
type Sink = TableWriter<BufWriter<Destination>>;

impl BatchArgs {
    fn sink(&self, kept: &[Kept]) -> io::Result<Sink> {
        let output = BufWriter::with_capacity(1 << 20, Destination::open(&self.out)?);
        TableWriter::new(output, &columns_with(self.method.method, self.critical, kept), is_parquet(&self.out))
    }

    /// Solves one chunk, `scenes` to begin with, which come behind `before` others, while the one before is written and the next is read.
    fn solve_all(
        &self,
        mut scenes: Option<Scenes>,
        before: u64,
        source: &mut Cut,
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
                || {
                    scenes
                        .as_ref()
                        .map(|scenes| solve(scenes, before + tally.rows + 1, method, self.critical, is_parquet))
                },
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

/// A part of the scenes: which, from 1, and of how many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    index: u64,
    of: u64,
}

impl Part {
    /// Its rows of `count`, from 0; bounds within are multiples of `multiple`.
    fn rows(self, count: u64, multiple: u64) -> Range<u64> {
        let bound = |index: u64| {
            let exact = (u128::from(count) * u128::from(index) / u128::from(self.of)) as u64;
            if index == self.of { count } else { exact / multiple * multiple }
        };
        bound(self.index - 1)..bound(self.index)
    }
}

/// `I/N`.
fn part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((index, of)) if 1 <= index && index <= of => Ok(Part { index, of }),
        _ => Err("write which part and of how many, from 1: 7/1000".to_owned()),
    }
}

fn summary(tally: &Tally, part: Option<Part>) -> String {
    if let (0, Some(Part { index, of })) = (tally.rows, part) {
        return format!(
            "0 rows: part {index} of {of} is empty: a part of CSV has whole lines, and one of random scenes or Parquet whole \
             blocks of {PART} rows"
        );
    }
    if tally.rows == 0 {
        return "0 rows: the table has a first line with names and no scene below it".to_owned();
    }
    let mut text = format!("{}: {} bad, {} undecided", count(tally.rows, "row"), tally.bad, tally.undecided);
    if tally.unstable > 0 {
        text.push_str(&format!(", {} with a step beyond the stability limit", tally.unstable));
    }
    if tally.outside_eq14 > 0 {
        text.push_str(&format!(
            ", {} with an S of Eq. 14 outside its range (13.5 to 96.7 MPa, d < 76 mm, V0 < 1200 m/s)",
            tally.outside_eq14
        ));
    }
    text
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

    /// Columns that go with the scenes.
    fn kept(&self) -> &[Kept] {
        match self {
            Self::Csv(table, _) => table.layout().kept(),
            #[cfg(feature = "parquet")]
            Self::Parquet(table, ..) => table.layout().kept(),
            Self::Random { .. } => &[],
        }
    }

    /// How many scenes there are, from the beginning; `path` is theirs. A table without a number of rows is read through.
    fn count(&mut self, path: &Path) -> Result<u64, CliError> {
        match self {
            _ if is_standard(path) => {
                let help = "write the scenes into a file first";
                Err(CliError::usage("standard input cannot be cut into parts: it is read once", help))
            }
            Self::Csv(table, _) => {
                let (mut count, mut used) = (0, None);
                // Ends with the table.
                loop {
                    let rows = table.next_rows(CHUNK, used)?;
                    if rows.is_empty() {
                        return Ok(count);
                    }
                    count += rows.len() as u64;
                    used = Some(rows);
                }
            }
            #[cfg(feature = "parquet")]
            Self::Parquet(table, ..) => Ok(table.rows()),
            Self::Random { end, .. } => Ok(*end),
        }
    }

    /// What bounds of parts are multiples of.
    fn multiple(&self) -> u64 {
        if matches!(self, Self::Random { .. }) { PART as u64 } else { 1 }
    }

    /// Leaves out the next `count` scenes.
    fn skip(&mut self, mut count: u64) -> Result<(), CliError> {
        match self {
            Self::Csv(table, _) => {
                let mut used = None;
                while count > 0 {
                    let rows = table.next_rows(count.min(CHUNK as u64) as usize, used)?;
                    // A table that was cut since it was counted.
                    count = if rows.is_empty() { 0 } else { count - rows.len() as u64 };
                    used = Some(rows);
                }
            }
            #[cfg(feature = "parquet")]
            Self::Parquet(table, ..) => table.skip(count)?,
            Self::Random { next, .. } => *next = count,
        }
        Ok(())
    }

    /// The next chunk of at most `most` scenes, `None` at the end; the memory of `used` is reused.
    fn next_scenes(&mut self, most: usize, used: Option<Scenes>) -> Result<Option<Scenes>, CliError> {
        let scenes = match self {
            Self::Csv(table, varied) => {
                let used = match used {
                    Some(Scenes::Table(rows) | Scenes::Varied(rows, _)) => Some(rows),
                    _ => None,
                };
                of_rows(table.next_rows(most, used)?, varied.as_ref())
            }
            #[cfg(feature = "parquet")]
            Self::Parquet(table, progress, varied) => {
                let rows = table.next_rows(most)?;
                progress.inc(rows.len() as u64);
                of_rows(rows, varied.as_ref())
            }
            Self::Random { seed, next, end, progress } => {
                let from = *next;
                *next = (*end).min(from.saturating_add(most as u64));
                progress.set_position(from);
                Scenes::Random { seed: *seed, rows: from..*next }
            }
        };
        Ok(Some(scenes).filter(|scenes| !scenes.is_empty()))
    }
}

/// The scenes of a part.
struct Cut {
    source: Source,
    left: u64,
}

impl Cut {
    /// The next chunk, as of the whole.
    fn next_scenes(&mut self, used: Option<Scenes>) -> Result<Option<Scenes>, CliError> {
        let scenes = self.source.next_scenes(self.left.min(CHUNK as u64) as usize, used)?;
        self.left -= scenes.as_ref().map_or(0, |scenes| scenes.len() as u64);
        Ok(scenes)
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
    fn parts_one_behind_the_other_are_the_whole() {
        for (count, of) in [(10, 3), (1, 4), (0, 2), (u64::MAX, 1000), (1_000_001, 7)] {
            let parts: Vec<_> = (1..=of).map(|index| Part { index, of }.rows(count, 1)).collect();
            assert_eq!((parts[0].start, parts[of as usize - 1].end), (0, count));
            assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
        }
        assert_eq!(Part { index: 2, of: 3 }.rows(10_000, 256), 3328..6656);
        assert_eq!(part("7/1000"), Ok(Part { index: 7, of: 1000 }));
        for text in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3"] {
            assert!(part(text).is_err(), "{text}");
        }
    }

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
