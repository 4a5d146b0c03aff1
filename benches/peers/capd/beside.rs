//! Enclosures of CAPD beside penetrode's, of the same `f64` in one run: time of a flight, and widths of its end.
//!
//! `cargo run --release --bin capd -- ../../target/flight [ROUNDS]`, after the build of `README.md`. Each round asks CAPD and then
//! penetrode for every scene of `verification/references/capd.json`; a time is the least of all rounds, since others may use the
//! machine too. Both answers must have a number in common before they are compared.

#![expect(clippy::expect_used, clippy::panic, reason = "a bench that cannot be set up stops")]

use std::fmt::Write as _;
use std::hint::black_box;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::time::Instant;

use penetrode::exchange::scene_file::SHIPPED;
use penetrode::integrators::{Detail, Enclosure};
use penetrode::physics::ball::Ball;
use penetrode::physics::{Problem, Scene, State};
use serde_json::Value;

/// Scenes that are listed one by one; of the others the middle ones are.
const LISTED: [&str; 7] = ["crater", "tunnel", "perforate", "graze", "stiff", "spring-and-drag", "paper-slab"];

/// Flights of one round; fewer of CAPD where one takes a second.
const REPEATS: usize = 40;

/// What one program says of the end of a flight.
#[derive(Clone, Copy)]
struct Answer {
    microseconds: f64,
    /// Depth, time, velocity.
    intervals: [(f64, f64); 3],
}

impl Answer {
    /// Widths in spacings of `f64`; none of a number that is given.
    fn widths(&self) -> [f64; 3] {
        self.intervals.map(|(low, high)| if low == high { 0.0 } else { (high - low) / (high.next_up() - high) })
    }

    fn least(self, other: Self) -> Self {
        Self { microseconds: self.microseconds.min(other.microseconds), ..self }
    }
}

/// The line of [`flight.cpp`](flight.cpp) for a problem.
fn line(name: &str, problem: &Problem) -> String {
    let two = |value: f64| format!("{value:e} {value:e}");
    let repeats = if name == "stiff" { 1 } else { REPEATS };
    let Problem { mass, impact_speed, exit_depth, stages, .. } = problem;
    let mut text =
        format!("{name} {repeats} {} {} {} {}", two(*mass), two(*impact_speed), two(*exit_depth), stages.len());
    for stage in stages {
        for value in [stage.static_force, stage.stiffness, stage.viscosity, stage.drag, stage.end] {
            let _ = write!(text, " {}", two(value));
        }
    }
    text + "\n"
}

/// What CAPD says of every line; `None` where it refuses.
fn of_capd(program: &str, lines: &str) -> Vec<Option<Answer>> {
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{program}: {error}"));
    child.stdin.take().expect("a pipe").write_all(lines.as_bytes()).expect("CAPD reads its questions");
    let output = child.wait_with_output().expect("CAPD ends");
    let answers = String::from_utf8(output.stdout).expect("text");
    let answer = |line: &str| {
        let value: Value = serde_json::from_str(line).expect("JSON");
        let end = value["events"].as_array().expect("events").last().filter(|_| value["refused"] == "")?;
        let interval = |name: &str| {
            let side = |index: usize| end[name][index].as_f64().expect("a number");
            (side(0), side(1))
        };
        let intervals = ["depth_m", "time_s", "velocity_m_s"].map(interval);
        Some(Answer { microseconds: value["microseconds"].as_f64().expect("a time"), intervals })
    };
    answers.lines().map(answer).collect()
}

/// What penetrode says of `problem`.
fn of_penetrode(problem: &Problem) -> Answer {
    let exact: Problem<Ball> = problem.cast();
    let enclose = || Enclosure.enclose(black_box(&exact), Detail::Events).unwrap_or_else(|error| panic!("{error}"));
    let State { depth, time, velocity } = enclose().end;
    let mut least = f64::INFINITY;
    for _ in 0..REPEATS {
        let start = Instant::now();
        black_box(enclose());
        least = least.min(start.elapsed().as_secs_f64() * 1e6);
    }
    Answer { microseconds: least, intervals: [depth, time, velocity].map(Ball::interval) }
}

fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let mut words = std::env::args().skip(1);
    let program = words.next().expect("the program that README.md builds");
    let rounds = words.next().map_or(5, |rounds| rounds.parse().expect("a number of rounds"));
    let recorded: Value =
        serde_json::from_str(include_str!("../../../verification/references/capd.json")).expect("JSON");
    let problems: Vec<(String, Problem)> = recorded["scenes"]
        .as_array()
        .expect("scenes")
        .iter()
        .map(|scene| {
            let name = scene["name"].as_str().expect("a name");
            let text = scene["text"]
                .as_str()
                .unwrap_or_else(|| SHIPPED.iter().find(|(shipped, _)| *shipped == name).expect("a scene that ships").1);
            let scene = Scene::from_toml(text, name).unwrap_or_else(|error| panic!("{name}: {error}"));
            (name.to_owned(), scene.problem().unwrap_or_else(|error| panic!("{name}: {error}")))
        })
        .collect();
    let lines: String = problems.iter().map(|(name, problem)| line(name, problem)).collect();
    let mut found: Vec<Option<(Answer, Answer)>> = Vec::new();
    for round in 0..rounds {
        let theirs = of_capd(&program, &lines);
        assert_eq!(theirs.len(), problems.len(), "CAPD answers every line");
        for (index, (theirs, (name, problem))) in theirs.into_iter().zip(&problems).enumerate() {
            let ours = of_penetrode(problem);
            let Some(theirs) = theirs else {
                println!("CAPD refuses {name}");
                found.extend((round == 0).then_some(None));
                continue;
            };
            for (one, other) in theirs.intervals.iter().zip(&ours.intervals) {
                assert!(one.0 <= other.1 && other.0 <= one.1, "{name}: {one:?} and {other:?}");
            }
            match found.get_mut(index) {
                Some(Some(least)) => *least = (least.0.least(theirs), least.1.least(ours)),
                _ => found.push(Some((theirs, ours))),
            }
        }
    }
    println!("| scene | CAPD: us | depth, time, velocity (ulp) | penetrode: us | depth, time, velocity (ulp) |");
    println!("|---|---|---|---|---|");
    let row = |name: &str, sides: [(f64, [f64; 3]); 2]| {
        let cells = sides.map(|(time, [x, t, v])| format!("{time:.1} | {x:.1}, {t:.1}, {v:.1}"));
        println!("| {name} | {} | {} |", cells[0], cells[1]);
    };
    let mut others = Vec::new();
    for ((name, _), sides) in problems.iter().zip(&found) {
        let Some((theirs, ours)) = sides else { continue };
        if LISTED.contains(&name.as_str()) {
            row(name, [theirs, ours].map(|answer| (answer.microseconds, answer.widths())));
        } else if name.starts_with("drawn") {
            others.push([*theirs, *ours]);
        }
    }
    let summary = |side: usize| {
        let all = |of: &dyn Fn(&Answer) -> f64| middle(others.iter().map(|sides| of(&sides[side])).collect());
        let width = |index: usize| {
            middle(others.iter().map(|sides| sides[side].widths()[index]).filter(|width| *width > 0.0).collect())
        };
        (all(&|answer| answer.microseconds), [width(0), width(1), width(2)])
    };
    row(&format!("{} random ones, median", others.len()), [summary(0), summary(1)]);
}
