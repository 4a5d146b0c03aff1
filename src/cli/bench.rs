//! `penetrode bench`: what an accuracy costs, by every method, by other programs, and by the paper's scheme.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use indicatif::ProgressBar;

use super::output::{Text, error_text, escape_terminal, new_progress, say_line, show_progress, wrapped};
use super::verify::report_line;
use super::{Answer, Ask, CliError, Exit, Settings, command_typed, program};
use crate::exchange::peers::{Environment as PeerEnvironment, Peer};
use crate::exchange::scene_file::shipped;
use crate::physics::Scene;
use crate::report::bench::{BenchJson, CaseJson, files};
use crate::report::{Environment, cells, folder};
use crate::studies::bench::growth::{self, Growth};
use crate::studies::bench::step_size::{self, Curve, Held, LEVELS as STEP_LEVELS, StepStudy};
use crate::studies::bench::work_precision::{
    self, Case, Contender, LEVELS, Run, RunState, by_method, fastest, fastest_of, least_error,
};
use crate::studies::bench::{Effort, peers};
use crate::suite::grouped;
use crate::text::{clipped, number, prefixed};

/// Scenes that are measured where none is given: those of the comparison with other solvers, and the stiff one.
const DEFAULT_SCENES: [&str; 5] = ["crater", "tunnel", "perforate", "graze", "stiff"];

/// Varied scenes where no scene is given.
const VARIED: usize = 1000;

/// Arguments of `bench`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/bench.txt"))]
#[command(mut_arg("set", |set| set.requires("scenes")))]
pub struct BenchArgs {
    /// Scene files or names of scenes that ship [default: five, and varied].
    ///
    /// The five are crater, tunnel, perforate, graze and stiff; 1000 varied ones stand beside them.
    pub scenes: Vec<String>,
    /// What is set in each of them.
    #[command(flatten)]
    pub settings: Settings,
    /// What is measured.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PART,..",
          default_values_t = [Part::WorkPrecision, Part::StepSize])]
    pub parts: Vec<Part>,
    /// Also heyoka, scipy and scikit-sundae (Python 3.11).
    #[arg(long)]
    pub peers: bool,
    /// Also this solver, which speaks the peer protocol.
    #[arg(long, value_name = "CMD")]
    pub peer: Vec<String>,
    /// How many varied scenes.
    ///
    /// By default 1000 where no scene is given, else none.
    #[arg(long, value_name = "N")]
    pub varied: Option<u16>,
    /// Seed of varied scenes and random steps.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Samples of each time.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub repeats: u16,
    /// Most scenes of the part scaling.
    #[arg(long, value_name = "N", default_value_t = 10_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub most: u64,
    /// Folder of a report with tables and figures.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// A part of the bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Error and cost of every method at every tolerance.
    WorkPrecision,
    /// The paper's scheme against its step, and the largest step that holds an error.
    StepSize,
    /// Time a scene and memory of batch from one scene to millions.
    Scaling,
}

impl Ask for BenchArgs {
    type Answer = BenchJson;

    fn ask(&self) -> Result<Answer<BenchJson>, CliError> {
        self.out.as_deref().map(|folder| folder::check(folder, "bench")).transpose()?;
        let scenes = self.scenes()?;
        let mut peers = self.start_peers()?;
        let report = self.measure(&scenes, &mut peers)?;
        self.out.as_deref().map(|folder| folder::write(files(&report), folder)).transpose()?;
        Ok(Answer { text: self.text(&report), data: Some(report), exit: Exit::Success })
    }
}

impl BenchArgs {
    fn has(&self, part: Part) -> bool {
        self.parts.contains(&part)
    }

    /// The scenes under names of their own.
    fn scenes(&self) -> Result<Vec<(String, Scene)>, CliError> {
        if self.scenes.is_empty() {
            let scenes = DEFAULT_SCENES.iter().filter_map(|name| Some((*name, shipped(name)?)));
            return scenes.map(|(name, text)| Ok((name.to_owned(), Scene::from_toml(text, name)?))).collect();
        }
        let mut scenes: Vec<(String, Scene)> = Vec::new();
        for path in &self.scenes {
            let (scene, _) = self.settings.read_problem(path)?;
            let stem = Path::new(path).file_stem().map_or_else(|| path.clone(), |stem| stem.to_string_lossy().into());
            let stem = if path == "-" { "standard-input".to_owned() } else { stem };
            // Two files of one name in two folders are two scenes.
            let is_free = |name: &String| name != "varied" && scenes.iter().all(|(known, _)| known != name);
            let numbered = (2..).map(|number| format!("{stem}-{number}"));
            let name = [stem.clone()].into_iter().chain(numbered).find(is_free).unwrap_or_default();
            scenes.push((name, scene));
        }
        Ok(scenes)
    }

    fn varied(&self) -> usize {
        self.varied.map_or(if self.scenes.is_empty() { VARIED } else { 0 }, usize::from)
    }

    /// The peers by the names of the tables. None is asked in vain: they take part in work-precision alone.
    fn start_peers(&self) -> Result<Vec<(String, Peer)>, CliError> {
        let mut peers = Vec::new();
        if self.peers {
            for (name, bundled, options) in peers::BUNDLED {
                let environment = PeerEnvironment::ensure(bundled, &mut |line| say_line(line))?;
                let command = format!("{} {options}", environment.command(bundled));
                peers.push((name.to_owned(), Peer::start(&command)?));
            }
        }
        for command in &self.peer {
            let peer = Peer::start_adaptive(command)?;
            let name = escape_terminal(&peer.identity().name);
            let taken = peers.iter().filter(|(known, _): &&(String, Peer)| known.starts_with(&name)).count();
            peers.push((if taken == 0 { name } else { format!("{name} {}", taken + 1) }, peer));
        }
        if !peers.is_empty() && !self.has(Part::WorkPrecision) {
            return Err(CliError::usage("peers take part in work-precision alone", "add it to --parts"));
        }
        Ok(peers)
    }

    fn measure(&self, scenes: &[(String, Scene)], peers: &mut [(String, Peer)]) -> Result<BenchJson, CliError> {
        let effort = Effort { samples: usize::from(self.repeats) };
        let progress = new_progress();
        show_progress(&progress, 0, "{bar:30} {pos}/{len}, {eta} left {msg}");
        let mut cases = Vec::new();
        if self.has(Part::WorkPrecision) {
            progress.set_message("exact answers");
            for (name, scene) in scenes {
                cases.push(Case::of_scene(name, scene)?);
            }
            if self.varied() > 0 {
                cases.push(Case::varied(self.varied(), self.seed)?);
            }
        }
        for (_, peer) in &mut *peers {
            if cases.first().is_some_and(|case| !peers::is_timed(case, peer)) {
                let message = format!("`{}` answers without wall_ns, and its time is not known", peer.command());
                return Err(CliError::usage(message, "let its answers have the time of one solution (ns)"));
            }
        }
        progress.inc_length((cases.len() * (Contender::all().len() + peers.len())) as u64);
        let mut runs = Vec::new();
        for case in &cases {
            for contender in Contender::all() {
                progress.set_message(format!("{}, {}", case.name, contender.name()));
                runs.extend(work_precision::runs(case, contender, effort));
                progress.inc(1);
            }
            for (name, peer) in &mut *peers {
                progress.set_message(format!("{}, {name}", case.name));
                runs.extend(peers::runs(case, name, peer, effort));
                progress.inc(1);
            }
        }
        let mut studies = Vec::new();
        if self.has(Part::StepSize) {
            progress.inc_length(scenes.len() as u64);
            for (name, scene) in scenes {
                progress.set_message(format!("{name}, steps"));
                studies.extend(step_size::of_scene(name, scene, effort, self.seed)?);
                progress.inc(1);
            }
        }
        let growths = if self.has(Part::Scaling) { self.growth(&progress)? } else { Vec::new() };
        progress.finish_and_clear();
        let peers = peers.iter().map(|(name, peer)| (name.clone(), peer.identity().to_string())).collect();
        let understood = format!("{scenes:?}, {} varied", self.varied());
        Ok(BenchJson {
            schema: "penetrode/bench/1",
            scenes: cases.iter().map(CaseJson::from).collect(),
            fastest: fastest(&runs),
            runs,
            step_size: studies,
            growth: growths,
            environment: Environment::of_scenes(self.seed, command_typed(), &understood, peers),
        })
    }

    fn growth(&self, progress: &ProgressBar) -> Result<Vec<Growth>, CliError> {
        const THREADS: [u16; 2] = [1, 2];
        let failed = |message: String| CliError::failed(message, "");
        let program = program().map_err(|error| failed(format!("where is this program? {error}")))?;
        let counts = growth::counts(self.most);
        progress.inc_length((counts.len() * THREADS.len()) as u64);
        progress.set_message("batches");
        growth::measure(&program, &counts, &THREADS, self.seed, &|| progress.inc(1))
            .map_err(|error| failed(error.to_string()))
    }

    fn text(&self, report: &BenchJson) -> String {
        let mut text = Text::default();
        if report.environment.profile != "release" {
            text.part(format!("built with profile {}: times mean little", report.environment.profile));
        }
        if !report.runs.is_empty() {
            text.part("Fastest median time of a flight in µs within an error, and the setting");
            report.scenes.iter().for_each(|case| add_case(&mut text, report, case));
        }
        if !report.step_size.is_empty() {
            text.part("Largest step that holds an error: step [s] or tolerance, steps, time [s]");
            text.line("  boundaries: end = step-end, int. = interpolated, land = landed");
            report.step_size.iter().for_each(|study| add_study(&mut text, study));
        }
        if !report.growth.is_empty() {
            text.part("Cost of a batch as work grows");
            text.table(&cells::GROWTH, cells::growth(&report.growth));
        }
        if let Some(folder) = &self.out {
            text.part(report_line(folder));
        }
        text.finish()
    }
}

fn add_case(text: &mut Text, report: &BenchJson, case: &CaseJson) {
    let title = case.title.as_deref().map_or(String::new(), |title| format!(": {title}"));
    text.part(wrapped("", &escape_terminal(&format!("{}{title}", case.name))));
    if case.exact < case.problems {
        text.line("  no closed form: errors against a Taylor series to round-off");
    }
    let methods: Vec<_> = by_method(&report.runs).filter(|runs| runs[0].scene == case.name).collect();
    let row = |runs: &&[Run]| {
        let fastest = LEVELS.map(|level| {
            fastest_of(runs, level).map_or("-".to_owned(), |(run, ns)| format!("{} {}", micro(ns), run.setting))
        });
        let least = error_text(least_error(runs));
        [clipped(&escape_terminal(&runs[0].method), 15)].into_iter().chain(fastest).chain([least]).collect::<Vec<_>>()
    };
    text.table(&["method", "1e-3", "1e-6", "1e-9", "1e-12", "least"], methods.iter().map(row));
    for runs in methods {
        text.lines(notes_of(runs));
    }
}

/// What was not right, one paragraph for each reason of a method.
fn notes_of(runs: &[Run]) -> Vec<String> {
    let not_right = runs.iter().filter(|run| run.state != RunState::Right);
    let groups = grouped(not_right, |run| (run.state, run.reason.as_deref().unwrap_or_default()));
    let paragraph = |((state, reason), members): ((RunState, &str), Vec<&Run>)| {
        let settings = members.iter().map(|run| {
            let lost = if state == RunState::Failed { run.failed } else { run.undecided };
            if flights_of(run) > 1 { format!("{} ({lost})", run.setting) } else { run.setting.clone() }
        });
        let settings = if members.len() == runs.len() && flights_of(members[0]) <= 1 {
            "every setting".to_owned()
        } else {
            settings.collect::<Vec<_>>().join(", ")
        };
        let text = format!("{state}: {} at {settings}: {reason}", members[0].method);
        // Further lines are indented by four.
        wrapped("    ", &escape_terminal(&text)).replacen("    ", "  ", 1)
    };
    groups.into_iter().map(paragraph).collect()
}

fn flights_of(run: &Run) -> usize {
    run.right + run.undecided + run.failed
}

fn add_study(text: &mut Text, study: &StepStudy) {
    text.part(format!("{}: {}", clipped(&escape_terminal(&study.scene), 40), study.quantity));
    let levels = STEP_LEVELS.map(|level| format!("{} %", 100.0 * level));
    let header: Vec<_> = ["method"].into_iter().chain(levels.iter().map(String::as_str)).collect();
    let row = |curve: &Curve| {
        let cell = |held: &Held| match (held.size, held.steps, held.time) {
            (Some(size), Some(steps), Some(time)) => {
                let size = if curve.adaptive { format!("{size:.0e}") } else { compact(size) };
                format!("{size} {} {}", compact(steps as f64), compact(1e-9 * time.median_ns))
            }
            _ => "none".to_owned(),
        };
        [short_variant(&curve.method)].into_iter().chain(curve.held.iter().map(cell)).collect::<Vec<_>>()
    };
    text.table(&header, study.curves.iter().map(row));
}

/// `predicted/int.`: names of variants are shortened to leave room for the numbers.
fn short_variant(name: &str) -> String {
    name.replace("interpolated", "int.").replace("step-end", "end").replace("landed", "land")
}

/// A time in µs: three digits, two below one, and thousands as `17k`, so that a slow machine widens no table.
fn micro(ns: f64) -> String {
    let us = 1e-3 * ns;
    if us < 0.995 {
        number(us, 2)
    } else if us < 9999.5 {
        number(us, 3)
    } else {
        compact(us)
    }
}

/// Two digits and the prefix of the unit: `1.2µ`, `83k`.
fn compact(value: f64) -> String {
    let (digits, prefix) = prefixed(value, 2);
    if prefix.is_empty() { digits.trim_end_matches(".0").to_owned() } else { digits + prefix }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compact_numbers_have_two_digits_and_a_prefix() {
        for (value, text) in [
            (1.234e-6, "1.2µ"),
            (8.3e4, "83k"),
            (999.6, "1.0k"),
            (690.0, "690"),
            (7.0, "7"),
            (4.5e-8, "45n"),
            (0.0, "0"),
            (1e-20, "1.0e-20"),
        ] {
            assert_eq!(compact(value), text);
        }
    }

    #[test]
    fn no_time_from_a_nanosecond_to_a_day_widens_a_table() {
        let mut ns = 1.0;
        while ns < 1e14 {
            let text = micro(ns);
            // With a setting of five or six characters and the blanks between, four columns fit.
            assert!(text.chars().count() <= if ns < 100.0 { 6 } else { 4 }, "{ns} ns: {text}");
            ns *= 1.37;
        }
        assert_eq!((micro(344.0), micro(1234.0), micro(1.7e7)), ("0.34".into(), "1.23".into(), "17k".into()));
    }
}
