//! Cost as work grows: `penetrode batch` from one scene to millions, as a process of its own.
//!
//! Up to [`FILE_MAX`] scenes come from a CSV table and the results go to one; beyond, scenes come from the generator
//! and the results go nowhere. Peak memory is the high-water mark that Linux keeps for the process, read while it runs.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::Serialize;

use crate::exchange::interruption;
use crate::exchange::tables::push_line;
use crate::studies::batch::{PART, SCENES, cells_of, random_rows};

/// Most scenes that are read from a file.
pub const FILE_MAX: u64 = 1_000_000;

/// Pause between two looks at the memory of the process.
const PAUSE: Duration = Duration::from_millis(1);

/// One run of `batch`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Growth {
    /// Scenes.
    pub scenes: u64,
    /// Threads.
    pub threads: u16,
    /// `file` or `generator`.
    pub source: Source,
    /// Time of the whole process, start and end included (s): the shortest of the runs.
    pub seconds: f64,
    /// That time over the scenes (ns).
    pub ns_a_scene: f64,
    /// Peak memory of the process (bytes); `null` where the system does not report it.
    pub peak_bytes: Option<u64>,
    /// Runs.
    pub runs: usize,
}

impl Growth {
    /// Time over the scenes (µs).
    pub fn microseconds_a_scene(&self) -> f64 {
        1e-3 * self.ns_a_scene
    }

    /// Peak memory (MB).
    pub fn peak_megabytes(&self) -> Option<f64> {
        self.peak_bytes.map(|bytes| 1e-6 * bytes as f64)
    }
}

/// Where scenes come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// A CSV table; the results go to one.
    File,
    /// The generator; the results are formatted and thrown away.
    Generator,
}

/// Counts of scenes: the powers of ten up to `most`.
pub fn counts(most: u64) -> Vec<u64> {
    std::iter::successors(Some(1_u64), |count| count.checked_mul(10)).take_while(|count| *count <= most).collect()
}

/// Runs `program batch` on each of `counts`, with each of `threads`.
///
/// Tables are written in a temporary folder and removed; a million scenes take some 150 MB, and their results as much.
///
/// # Errors
/// Where the table of scenes cannot be written, or the program cannot be run or fails.
pub fn measure(program: &Path, counts: &[u64], threads: &[u16], seed: u64, done: &dyn Fn()) -> io::Result<Vec<Growth>> {
    let folder = interruption::folder().map_err(during("a temporary folder"))?;
    let mut growths = Vec::new();
    for &scenes in counts {
        let table = folder.path().join("scenes.csv");
        let source = if scenes <= FILE_MAX { Source::File } else { Source::Generator };
        if source == Source::File {
            write_scenes(&table, scenes, seed).map_err(during("the table of scenes"))?;
        }
        for &threads in threads {
            growths.push(repeated(program, &table, (scenes, threads), source, seed)?);
            done();
        }
    }
    Ok(growths)
}

/// Adds to an error what was being done when it came.
fn during(what: &'static str) -> impl Fn(io::Error) -> io::Error + Copy {
    move |cause| io::Error::new(cause.kind(), format!("{what}: {cause}"))
}

/// The shortest of some runs: what disturbs a process only ever makes it longer.
fn repeated(
    program: &Path,
    table: &Path,
    (scenes, threads): (u64, u16),
    source: Source,
    seed: u64,
) -> io::Result<Growth> {
    let runs: usize = if scenes <= 100_000 { 5 } else { 1 };
    let mut growth =
        Growth { scenes, threads, source, seconds: f64::INFINITY, ns_a_scene: 0.0, peak_bytes: None, runs };
    for _ in 0..runs {
        let mut command = Command::new(program);
        command.arg("batch").args(["--threads", &threads.to_string()]);
        match source {
            Source::File => command.arg(table).arg("--out").arg(table.with_file_name("results.csv")),
            Source::Generator => command.args([&format!("random:{scenes}:{seed}"), "--out", "-"]),
        };
        let (seconds, peak_bytes) = run(&mut command, scenes)?;
        growth.seconds = growth.seconds.min(seconds);
        growth.peak_bytes = growth.peak_bytes.max(peak_bytes);
    }
    growth.ns_a_scene = growth.seconds * 1e9 / scenes as f64;
    Ok(growth)
}

/// Runs `command` to its end: time (s) and peak memory (bytes).
fn run(command: &mut Command, scenes: u64) -> io::Result<(f64, Option<u64>)> {
    let failed = during("penetrode batch");
    let started = Instant::now();
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().map_err(failed)?;
    // A thread waits, so that the time is that of the process and not of the next look at its memory.
    let id = child.id();
    let waiter = thread::spawn(move || (child.wait_with_output(), started.elapsed().as_secs_f64()));
    let mut peak = None;
    while !waiter.is_finished() {
        peak = peak.max(peak_bytes(id));
        thread::sleep(PAUSE);
    }
    let (ended, seconds) = waiter.join().map_err(|_| failed(io::Error::other("the wait for it failed")))?;
    let ended = ended.map_err(failed)?;
    if ended.status.success() {
        return Ok((seconds, peak));
    }
    let said = String::from_utf8_lossy(&ended.stderr);
    let said: String = said.lines().last().unwrap_or("").chars().take(200).collect();
    Err(io::Error::other(format!("batch of {scenes} scenes ended with {}: {said}", ended.status)))
}

/// High-water mark of the resident memory of process `id` (bytes), where the system has one to read.
fn peak_bytes(id: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let kilobytes = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * kilobytes.trim().trim_end_matches("kB").trim().parse::<u64>().ok()?)
}

/// Writes the first `count` scenes of the random table with `seed` as CSV.
fn write_scenes(path: &Path, count: u64, seed: u64) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{}", SCENES.header())?;
    let mut left = count as usize;
    for part in 0.. {
        for scene in random_rows(seed, part).take(left) {
            let mut line = String::new();
            push_line(&mut line, &cells_of(&scene));
            file.write_all(line.as_bytes())?;
        }
        left = left.saturating_sub(PART);
        if left == 0 {
            break;
        }
    }
    file.flush()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;
    use crate::exchange::tables::CsvTable;
    use crate::physics::Scene;
    use crate::studies::batch::Scenes;

    #[test]
    fn the_table_reads_back_to_the_scenes_of_the_generator() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scenes.csv");
        for count in [1, 1023, 1024, 1500] {
            write_scenes(&path, count, 7).unwrap();
            let mut table = CsvTable::new("scenes", File::open(&path).unwrap(), &SCENES).unwrap();
            let read = Scenes::Table(table.next_rows(10_000, None).unwrap());
            let expected: Vec<Scene> = (0..6).flat_map(|part| random_rows(7, part)).take(count as usize).collect();
            assert_eq!(read.scenes(0..read.len()), expected.into_iter().map(Ok).collect::<Vec<_>>());
        }
    }

    #[test]
    fn counts_are_powers_of_ten_up_to_the_most() {
        assert_eq!(counts(1000), [1, 10, 100, 1000]);
        assert_eq!(counts(999), [1, 10, 100]);
    }

    #[test]
    fn the_memory_of_a_process_is_read_where_linux_tells_it() {
        let peak = peak_bytes(std::process::id());
        assert_eq!(peak.is_some(), cfg!(target_os = "linux"));
        assert!(peak.is_none_or(|bytes| bytes > 1 << 20));
    }
}
