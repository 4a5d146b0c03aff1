//! Other Rust solvers beside penetrode's, in one run: time at an error reached, scene by scene.
//!
//! `cargo run --release` (or `taskset -c 1 cargo run --release -- tunnel varied`, pinned, for some scenes only). Every
//! answer is compared with the closed form before anything is timed. An error is the largest of time, depth, velocity
//! and the state at the first boundary, over max(1, condition number). Each solver solves them at tolerances from 1e-3 to
//! 1e-13; a column shows the fastest that reached its error, as the median of interleaved rounds, with half the
//! spread of the middle half of the rounds, and over the time of penetrode's Taylor series.

#![expect(clippy::expect_used, clippy::panic, reason = "a bench that cannot be set up stops")]

mod differential_equations_by_hand;
mod diffsol_by_hand;
mod ode_solvers_by_hand;
mod reduced;

use std::hint::black_box;
use std::time::Instant;

use penetrode::exchange::scene_file::SHIPPED;
use penetrode::integrators::diffsol::{Diffsol, Scheme};
use penetrode::integrators::{ClosedForm, Detail, Flight, IntegrationError, Integrator, Taylor};
use penetrode::physics::reference::{self, Conditions, Source};
use penetrode::physics::{EventKind, Outcome, Problem, Scene, State};
use penetrode::studies::error::Truth;
use penetrode::studies::random_scenes::Generator;

use reduced::{Reduced, Solved, StageEnd, chain};

/// Errors of the columns.
const LEVELS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

/// Rounds of timing: in each, every solver solves them once.
const ROUNDS: usize = 9;

/// Time of one sample (s).
const SAMPLE: f64 = 2e-3;

/// Share of the varied scenes that must reach an error.
const SHARE: f64 = 0.99;

/// A solver at a tolerance.
#[derive(Clone, Copy)]
struct Config {
    row: &'static str,
    method: Method,
    rtol: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Method {
    Taylor,
    ClosedForm,
    Adapter(Scheme),
    DiffsolTsit45,
    DiffsolBdf,
    OdeDopri5,
    OdeDop853,
    DeDopri5,
    DeDop853,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Taylor => "taylor",
            Self::ClosedForm => "closed form",
            Self::Adapter(scheme) => scheme.name(),
            Self::DiffsolTsit45 => "tsit45",
            Self::DiffsolBdf => "bdf",
            Self::OdeDopri5 | Self::DeDopri5 => "dopri5",
            Self::OdeDop853 | Self::DeDop853 => "dop853",
        }
    }
}

const REFERENCE_ROW: &str = "penetrode taylor";

fn configs() -> Vec<Config> {
    let mut configs = vec![
        Config { row: "closed form", method: Method::ClosedForm, rtol: 0.0 },
        Config { row: REFERENCE_ROW, method: Method::Taylor, rtol: 0.0 },
    ];
    for (row, method) in [
        (REFERENCE_ROW, Method::Taylor),
        ("penetrode diffsol", Method::Adapter(Scheme::Tsit45)),
        ("penetrode diffsol", Method::Adapter(Scheme::Bdf)),
        ("diffsol by hand", Method::DiffsolTsit45),
        ("diffsol by hand", Method::DiffsolBdf),
        ("ode_solvers", Method::OdeDopri5),
        ("ode_solvers", Method::OdeDop853),
        ("differential-equations", Method::DeDopri5),
        ("differential-equations", Method::DeDop853),
    ] {
        configs.extend((3..=13).map(|digits| Config { row, method, rtol: 10f64.powi(-digits) }));
    }
    configs
}

impl Solved {
    fn of(flight: Result<Flight, IntegrationError>) -> Result<Self, String> {
        let flight = flight.map_err(|error| error.to_string())?;
        if flight.outcome == Outcome::Undecided {
            return Err("undecided".to_owned());
        }
        let boundary = |kind: EventKind| matches!(kind, EventKind::CraterEnd | EventKind::StageEnd(_));
        Ok(Self {
            perforated: !flight.outcome.is_stop(),
            first_boundary: flight.events.iter().find(|event| boundary(event.kind)).map(|event| event.state),
            end: flight.end,
        })
    }
}

/// Solves `problems` by `config`, one after the other, with what the solver reuses left in place.
fn solve_all(config: Config, problems: &[Problem], mut answer: impl FnMut(Result<Solved, String>)) {
    let rtol = config.rtol;
    let mut each = |solve_stage: &mut dyn FnMut(&Reduced) -> Result<StageEnd, String>| {
        problems.iter().for_each(|problem| answer(chain(problem, &mut *solve_stage)));
    };
    match config.method {
        Method::DiffsolTsit45 => diffsol_by_hand::with_tsit45(rtol, |solve| each(solve)),
        Method::DiffsolBdf => diffsol_by_hand::with_bdf(rtol, |solve| each(solve)),
        Method::OdeDopri5 => each(&mut |stage| ode_solvers_by_hand::dopri5(stage, rtol)),
        Method::OdeDop853 => each(&mut |stage| ode_solvers_by_hand::dop853(stage, rtol)),
        Method::DeDopri5 => each(&mut |stage| differential_equations_by_hand::dopri5(stage, rtol)),
        Method::DeDop853 => each(&mut |stage| differential_equations_by_hand::dop853(stage, rtol)),
        Method::Adapter(scheme) => {
            let adapter = Diffsol::new(scheme, rtol).reusing().expect("a tolerance that the adapter takes");
            problems.iter().for_each(|p| answer(Solved::of(adapter.solve(p, Detail::Events))));
        }
        Method::Taylor | Method::ClosedForm => {
            let taylor = Taylor::with_rtol(rtol).expect("a tolerance that the series takes");
            let method: &dyn Integrator = if config.method == Method::Taylor { &taylor } else { &ClosedForm };
            problems.iter().for_each(|p| answer(Solved::of(method.solve(p, Detail::Events))));
        }
    }
}

/// A problem with what is known of it.
struct Known {
    problem: Problem,
    exact: Solved,
    conditions: Conditions,
}

impl Known {
    fn of(scene: &Scene) -> Self {
        let problem = scene.problem().unwrap_or_else(|error| panic!("{error}"));
        // The closed form, or for a stage without one the Taylor series to round-off.
        let exact = Truth::of(&problem).unwrap_or_else(|error| panic!("{error}")).flight;
        let exact = Solved::of(Ok(exact)).unwrap_or_else(|error| panic!("{error}"));
        let conditions = reference::conditions(Source::Problem(&problem)).unwrap_or([1.0; 5]);
        Self { problem, exact, conditions }
    }

    /// Largest error of `found`; infinite for another outcome, or none.
    fn error(&self, found: &Result<Solved, String>) -> f64 {
        let Ok(found) = found else { return f64::INFINITY };
        let (exact, conditions) = (&self.exact, &self.conditions);
        if found.perforated != exact.perforated || found.first_boundary.is_some() != exact.first_boundary.is_some() {
            return f64::INFINITY;
        }
        let speed = self.problem.impact_speed;
        let over = |difference: f64, scale: f64, condition: f64| (difference / scale).abs() / condition.max(1.0);
        let mut errors = vec![
            over(found.end.time - exact.end.time, exact.end.time, conditions[1]),
            over(found.end.depth - exact.end.depth, exact.end.depth, conditions[0]),
            over(found.end.velocity - exact.end.velocity, speed, conditions[2]),
        ];
        if let (Some(found), Some(exact)) = (found.first_boundary, exact.first_boundary) {
            let State { time, velocity, .. } = exact;
            errors.push(over(found.time - time, time, conditions[3]));
            errors.push(over(found.velocity - velocity, speed, conditions[4]));
        }
        errors.into_iter().fold(0.0, |worst, error| if error <= worst { worst } else { error })
    }
}

/// A solver on a list of scenes: its error there, failed flights, and times of one flight (s).
struct Measured {
    config: Config,
    error: f64,
    failed: usize,
    times: Vec<f64>,
}

impl Measured {
    fn median(&self) -> f64 {
        quantile(&self.times, 0.5)
    }
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// `copies` of each scene follow one another, so that a solver reuses what it built.
fn measure(known: &[Known], copies: usize) -> Vec<Measured> {
    let problems: Vec<Problem> = known.iter().flat_map(|k| std::iter::repeat_n(k.problem.clone(), copies)).collect();
    let mut measured: Vec<Measured> = Vec::new();
    for config in configs() {
        let mut errors = Vec::with_capacity(problems.len());
        let mut answers = 0;
        solve_all(config, &problems, |found| {
            errors.push(known[answers / copies].error(&found));
            answers += 1;
        });
        let failed = errors.iter().filter(|error| !error.is_finite()).count() / copies;
        let error = quantile(&errors, if known.len() == 1 { 1.0 } else { SHARE });
        // Nobody times a wrong answer of ours.
        let is_exact = config.rtol == 0.0 && (config.method == Method::Taylor || failed < known.len());
        let worst = quantile(&errors, 1.0);
        assert!(!is_exact || worst <= 1e-12, "{} is off by {worst:e}", config.row);
        measured.push(Measured { config, error, failed, times: Vec::new() });
    }
    for _ in 0..ROUNDS {
        for one in measured.iter_mut().filter(|one| one.error <= LEVELS[0]) {
            let (start, mut flights) = (Instant::now(), 0);
            let elapsed = loop {
                solve_all(one.config, &problems, |found| {
                    let _ = black_box(found);
                });
                flights += problems.len();
                let elapsed = start.elapsed().as_secs_f64();
                if elapsed >= SAMPLE {
                    break elapsed;
                }
            };
            one.times.push(elapsed / flights as f64);
        }
    }
    measured
}

fn show(title: &str, measured: &[Measured]) {
    println!("\n{title}\n{:23}{}", "time of a flight [us]", LEVELS.map(|level| format!("{level:>14.0e}")).concat());
    let fastest = |row: &str, level: f64| {
        let reached = measured.iter().filter(|one| one.config.row == row && one.error <= level);
        reached.min_by(|a, b| a.median().total_cmp(&b.median()))
    };
    let mut rows: Vec<&str> = measured.iter().map(|one| one.config.row).collect();
    rows.dedup();
    let mut seen: Vec<&str> = Vec::new();
    for row in rows {
        if seen.contains(&row) {
            continue;
        }
        seen.push(row);
        let mut lines = [format!("{row:23}"), format!("{:23}", ""), format!("{:23}", "")];
        for level in LEVELS {
            let cells = match fastest(row, level) {
                None => ["-".to_owned(), String::new(), String::new()],
                Some(one) => {
                    let spread = 0.5 * (quantile(&one.times, 0.75) - quantile(&one.times, 0.25)) / one.median();
                    let ratio = fastest(REFERENCE_ROW, level).map_or(f64::NAN, |ours| one.median() / ours.median());
                    let at = match one.config.rtol {
                        0.0 => String::new(),
                        rtol => format!("{} {rtol:.0e}", one.config.method.name()),
                    };
                    let time = format!("{} +-{:.0}%", digits(one.median() * 1e6), 100.0 * spread);
                    [time, format!("{}x", digits(ratio)), at]
                }
            };
            for (line, cell) in lines.iter_mut().zip(cells) {
                *line += &format!("{cell:>14}");
            }
        }
        for line in lines.iter().filter(|line| !line.trim().is_empty()) {
            println!("{}", line.trim_end());
        }
    }
    for row in seen {
        let failed: Vec<String> = measured
            .iter()
            .filter(|one| one.config.row == row && one.failed > 0)
            .map(|one| format!("{}@{:.0e}({})", one.config.method.name(), one.config.rtol, one.failed))
            .collect();
        if !failed.is_empty() {
            println!("no outcome, or a wrong one: {row}\n{}", wrapped(&failed));
        }
    }
}

/// Items in lines of eighty columns.
fn wrapped(items: &[String]) -> String {
    let mut lines = vec![String::from(" ")];
    for item in items {
        match lines.last_mut() {
            Some(line) if line.len() + item.len() + 2 <= 80 => *line += &format!(" {item}"),
            _ => lines.push(format!("  {item}")),
        }
    }
    lines.join("\n")
}

/// Three digits.
fn digits(value: f64) -> String {
    let decimals = if value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    format!("{value:.decimals$}")
}

fn shipped(name: &str) -> Scene {
    let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap_or_else(|| panic!("no scene {name}")).1;
    Scene::from_toml(text, name).unwrap_or_else(|error| panic!("{error}"))
}

/// `--count ROW METHOD RTOL SCENE FLIGHTS`: that many flights and nothing else, for Callgrind to count. The scene `varied`
/// is another in each flight.
fn count(arguments: &[String]) {
    let [row, method, rtol, scene, flights] = arguments else {
        panic!("--count ROW METHOD RTOL SCENE FLIGHTS, such as --count 'diffsol by hand' tsit45 1e-6 tunnel 1000");
    };
    let rtol: f64 = rtol.parse().expect("a tolerance");
    let is_asked = |one: &Config| one.row == row && one.method.name() == method && one.rtol == rtol;
    let config = configs().into_iter().find(is_asked).unwrap_or_else(|| panic!("no {row}, {method}, at {rtol}"));
    let flights: usize = flights.parse().expect("a number of flights");
    let mut generator = Generator::new(1, "bench");
    let scenes: Vec<Scene> = match scene.as_str() {
        "varied" => (0..flights).map(|_| generator.next_scene()).collect(),
        name => vec![shipped(name); flights],
    };
    let problems: Vec<Problem> =
        scenes.iter().map(|scene| scene.problem().unwrap_or_else(|error| panic!("{error}"))).collect();
    solve_all(config, &problems, |found| {
        let _ = black_box(found);
    });
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|first| first == "--count") {
        return count(&arguments[1..]);
    }
    let wanted: Vec<String> = arguments.into_iter().filter(|argument| !argument.starts_with("--")).collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    println!(
        "Median of {ROUNDS} rounds and half the spread of their middle half; over the time of\n\
         penetrode's taylor; method and tolerance. - : the error is not reached."
    );
    for name in ["tunnel", "perforate", "crater", "graze", "stiff"] {
        if is_wanted(name) {
            // An explicit method takes a millisecond there.
            let copies = if name == "stiff" { 2 } else { 32 };
            show(name, &measure(&[Known::of(&shipped(name))], copies));
        }
    }
    if is_wanted("varied") {
        let mut generator = Generator::new(1, "bench");
        let known: Vec<Known> = (0..1000).map(|_| Known::of(&generator.next_scene())).collect();
        show("varied: 1000 scenes, an error that 99 % of them keep; in brackets: scenes", &measure(&known, 1));
    }
}
