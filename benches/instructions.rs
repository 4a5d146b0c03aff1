//! Instructions of a flight by every method, of a critical velocity and of a batch, and what each saving that
//! `solve --explain` names saves, as a pair with and without it.
//!
//! `cargo bench --bench instructions` counts them under Callgrind, each in a process of its own, so that no load on the
//! machine changes a count; it needs valgrind, which has no 512-bit vectors: lanes are counted with 256-bit ones. Every
//! answer is asserted before it is counted. A saving that saves nothing stops the run, and so does a sentence of
//! `--explain` that no pair stands for, which `cargo bench --bench instructions -- --complete` looks for without counting.

#![expect(clippy::panic, reason = "a bench that cannot be set up stops")]

use std::hint::black_box;
use std::process::Command;

use penetrode::exchange::scene_file::SHIPPED;
use penetrode::integrators::lanes::Batch;
use penetrode::integrators::{Accuracy, Detail, Method, MethodName, MethodOptions};
use penetrode::physics::{Problem, Scene, Stage};
use penetrode::studies::critical_velocity;
use penetrode::studies::error::Truth;
use penetrode::studies::error::{flight_error, is_fixed};
use penetrode::studies::quantity::Quantity;
use penetrode::studies::random_scenes::Generator;
use penetrode::studies::sensitivity;

/// A part of the name by which Callgrind knows [`counted`].
const COUNTED: &str = "--toggle-collect=*instructions::counted*";

/// Does `work`, the only part of the process that is counted.
#[inline(never)]
fn counted<R>(work: impl FnOnce() -> R) -> R {
    black_box(work())
}

/// Makes the problems of a case.
type Problems = fn() -> Vec<Problem>;

/// Sets a case up, asserts its answer, and does it in [`counted`].
type Case = Box<dyn Fn()>;

fn scene(name: &str) -> Scene {
    let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text);
    Scene::from_toml(text.unwrap_or_else(|| panic!("no scene {name}")), name).unwrap_or_else(|e| panic!("{e}"))
}

fn problem(name: &str) -> Problem {
    scene(name).problem().unwrap_or_else(|e| panic!("{e}"))
}

fn varied() -> Vec<Problem> {
    let mut generator = Generator::new(1, "bench");
    (0..1000).filter_map(|_| generator.next_scene().problem().ok()).collect()
}

fn method(name: MethodName) -> Method {
    Method::new(name, &MethodOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The method, once it solves `problem` to `limit` in every free quantity.
fn right(name: MethodName, problem: &Problem, limit: f64) -> Method {
    let method = method(name);
    let exact = Truth::of(problem).unwrap_or_else(|e| panic!("{e}")).flight;
    let flight = method.integrator().solve(problem, Detail::Events).unwrap_or_else(|e| panic!("{e}"));
    for quantity in [Quantity::Depth, Quantity::Time, Quantity::Velocity] {
        if !is_fixed(quantity, &exact) {
            let error = flight_error(quantity, &flight, &exact, problem.impact_speed).map_or(f64::INFINITY, f64::abs);
            assert!(error <= limit, "{name}: {} is off by {error:e}", quantity.name());
        }
    }
    method
}

/// Flights of `problems`, one after the other.
fn flights(name: MethodName, problems: Vec<Problem>, detail: Detail<'static>, limit: f64) -> Case {
    Box::new(move || {
        let methods: Vec<Method> = problems.iter().map(|problem| right(name, problem, limit)).collect();
        let method = methods.last().unwrap_or_else(|| panic!("no problem"));
        counted(|| problems.iter().filter(|p| black_box(method.integrator().solve(p, detail)).is_ok()).count());
    })
}

fn flight(name: MethodName, problem: Problem) -> Case {
    flights(name, vec![problem], Detail::Events, 1e-6)
}

fn taylor(problem: Problem) -> Case {
    flights(MethodName::Taylor, vec![problem], Detail::Events, 1e-12)
}

fn critical(name: MethodName) -> Case {
    Box::new(move || {
        let (scene, method) = (scene("paper-slab"), method(name));
        let find = || critical_velocity::of_scene(&scene, method.integrator()).unwrap_or_else(|e| panic!("{e}"));
        let exact = critical_velocity::exact(&scene).unwrap_or_else(|e| panic!("{e}"));
        assert!((find().velocity / exact - 1.0).abs() <= 1e-13, "{name}: {}", find().velocity);
        counted(find);
    })
}

fn batch(problems: fn() -> Vec<Problem>) -> Case {
    Box::new(move || {
        let problems = problems();
        let scalar = method(MethodName::Taylor);
        for (lane, problem) in Batch::new().solve(&problems).into_iter().zip(&problems) {
            let lane = lane.unwrap_or_else(|e| panic!("{e}"));
            let scalar = scalar.integrator().solve(problem, Detail::Events).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(lane.outcome, scalar.outcome);
            assert!((lane.end.depth / scalar.end.depth - 1.0).abs() < 1e-13, "{lane:?}");
        }
        counted(|| Batch::new().solve(black_box(&problems)));
    })
}

/// A thousand varied flights, with what a library builds for the first kept for the others.
fn kept(name: MethodName) -> Case {
    Box::new(move || {
        let (method, problems) = (method(name), varied());
        let solve_all = || {
            let reused = method.integrator().reusing();
            let integrator = reused.as_deref().unwrap_or(method.integrator());
            problems.iter().filter(|p| black_box(integrator.solve(p, Detail::Events)).is_ok()).count()
        };
        assert_eq!(solve_all(), problems.len());
        counted(solve_all);
    })
}

fn with_sensitivities(name: &'static str) -> Case {
    Box::new(move || {
        let (scene, problem) = (scene(name), problem(name));
        let exact = sensitivity::by_closed_form(&scene).unwrap_or_else(|e| panic!("{e}"));
        let find = || sensitivity::by_taylor(&scene).unwrap_or_else(|e| panic!("{e}"));
        assert!(find().disagreement(&exact).is_some_and(|worst| worst < 1e-12));
        let method = right(MethodName::Taylor, &problem, 1e-12);
        let (_, flight) = counted(|| (find(), method.integrator().solve(&problem, Detail::Events)));
        assert!(flight.is_ok());
    })
}

/// Name and case of everything that is counted for itself.
fn cases() -> Vec<(String, Case)> {
    let mut cases = Vec::new();
    for &name in MethodName::ALL {
        for scene in ["crater", "tunnel", "perforate", "graze"] {
            // The paper's scheme takes the millionth left to the far side of `graze` for a stop.
            let limit = match (name.accuracy(), scene) {
                (Accuracy::Step, "graze") => continue,
                (Accuracy::Step, _) => 1e-2,
                (_, "graze") => 1e-1,
                (Accuracy::RoundOff | Accuracy::Exact, _) => 1e-12,
                (Accuracy::Tolerance, _) => 1e-6,
            };
            let case = flights(name, vec![problem(scene)], Detail::Events, limit);
            cases.push((format!("{name}, {scene}"), case));
        }
    }
    for (name, _) in SHIPPED.iter().filter(|(name, _)| name.starts_with("law-")) {
        cases
            .push((format!("taylor, {name}"), flights(MethodName::Taylor, vec![problem(name)], Detail::Events, 1e-11)));
    }
    for name in [MethodName::Taylor, MethodName::Energy, MethodName::ClosedForm] {
        cases.push((format!("critical velocity by {name}, paper-slab"), critical(name)));
    }
    // A thousandth of each is a scene's.
    let thousand: [(&str, Problems); 4] = [
        ("crater", || vec![problem("crater"); 1000]),
        ("tunnel", || vec![problem("tunnel"); 1000]),
        ("perforate", || vec![problem("perforate"); 1000]),
        ("varied", varied),
    ];
    for (name, problems) in thousand {
        cases.push((format!("1000 in lanes, {name}"), batch(problems)));
    }
    cases
}

/// A saving: the same request with it and without.
struct Saving {
    name: &'static str,
    /// Part of the sentence by which `--explain` names it; `None` for what a caller of the library saves.
    sentence: Option<&'static str>,
    with: Case,
    without: Case,
}

/// One stage to rest.
fn of_stage(law: Stage) -> Problem {
    Problem::of_stages(1.0, 2.0, [law])
}

/// A term of the force that changes no digit, and yet is not left out.
const TINY: f64 = 1e-60;

/// `tunnel` with its far side at `share` of the depth of rest.
fn with_exit(share: f64) -> Problem {
    let mut problem = problem("tunnel");
    problem.exit_depth = share * Truth::of(&problem).unwrap_or_else(|e| panic!("{e}")).flight.end.depth;
    problem
}

/// `crater`, which stops before its second stage, and that stage alone beside it: what a method pays that builds it.
fn with_second_stage() -> Case {
    let crater = problem("crater");
    let second = Problem { stages: crater.stages[1..].iter().copied().collect(), crater: None, ..crater.clone() };
    flights(MethodName::Taylor, vec![crater, second], Detail::Events, 1e-12)
}

fn savings() -> Vec<Saving> {
    let law = Stage { static_force: 3.0, stiffness: 0.0, viscosity: 0.0, drag: 0.0, end: f64::INFINITY };
    let spring = Stage { stiffness: 5.0, ..law };
    let damped = Stage { viscosity: 0.5, ..spring };
    let drag = Stage { drag: 0.5, ..law };
    let stage = |law: Stage| taylor(of_stage(law));
    let tunnel = |detail| flights(MethodName::Taylor, vec![problem("tunnel")], detail, 1e-12);
    let saving = |name, sentence, with, without| Saving { name, sentence, with, without };
    vec![
        saving("stage not reached", Some("was not built"), taylor(problem("crater")), with_second_stage()),
        saving("no far side", Some("exit event not sought"), tunnel(Detail::Events), taylor(with_exit(2.0))),
        saving("rest before the exit", Some("exit not located"), taylor(with_exit(1.001)), taylor(with_exit(0.999))),
        saving("no trajectory", Some("trajectory not kept"), tunnel(Detail::Events), tunnel(Detail::Trajectory)),
        saving(
            "no Jacobian",
            Some("Jacobian not built"),
            flight(MethodName::Tsit45, problem("tunnel")),
            flight(MethodName::Bdf, problem("tunnel")),
        ),
        saving(
            "no sensitivities",
            Some("sensitivities not computed"),
            tunnel(Detail::Events),
            with_sensitivities("tunnel"),
        ),
        saving(
            "closed form",
            Some("no integration"),
            flight(MethodName::ClosedForm, problem("tunnel")),
            tunnel(Detail::Events),
        ),
        saving("constant force", Some("one step serves"), stage(law), stage(Stage { drag: TINY, ..law })),
        saving(
            "spring alone",
            Some("recurrence of one term"),
            stage(spring),
            stage(Stage { viscosity: TINY, ..spring }),
        ),
        saving("no drag", Some("recurrence of two terms"), stage(damped), stage(Stage { drag: TINY, ..damped })),
        saving(
            "no stiffness",
            Some("no search for hidden roots"),
            stage(drag),
            stage(Stage { stiffness: TINY, ..drag }),
        ),
        saving(
            "explicit where not stiff",
            Some(" by tsit45"),
            flight(MethodName::Adaptive, problem("tunnel")),
            flight(MethodName::Bdf, problem("tunnel")),
        ),
        saving(
            "implicit where stiff",
            Some(" by bdf"),
            flight(MethodName::Adaptive, problem("stiff")),
            flight(MethodName::Tsit45, problem("stiff")),
        ),
        saving("end alone", None, tunnel(Detail::End), tunnel(Detail::Events)),
        saving("solver kept", None, kept(MethodName::Tsit45), {
            flights(MethodName::Tsit45, varied(), Detail::Events, 1e-6)
        }),
        saving("lanes", None, batch(varied), flights(MethodName::Taylor, varied(), Detail::Events, 1e-9)),
    ]
}

/// What stands among the savings and is none: a fixed step has no error estimate to leave out, a stage may have it all, and laws of
/// one's own and proofs leave nothing out.
const NO_SAVING: [&str; 6] = [
    "error bar of the exit margin not given",
    "stiffness and drag",
    "a law of its own",
    "a table of velocity",
    "a proved bound of its error",
    "no proof was found",
];

/// Every sentence that `--explain` has for a shipped scene stands for a pair, and every pair for a sentence.
fn assert_complete(savings: &[Saving]) {
    let named: Vec<&str> = savings.iter().filter_map(|saving| saving.sentence).collect();
    let mut unheard = named.clone();
    for method in MethodName::ALL.iter().copied().map(method) {
        for problem in SHIPPED.iter().filter_map(|(name, _)| scene(name).problem().ok()) {
            let Ok(flight) = method.integrator().solve(&problem, Detail::Events) else { continue };
            for sentence in method.explain(&problem, &flight, Detail::Events) {
                let mut known = named.iter().chain(&NO_SAVING);
                assert!(known.any(|part| sentence.contains(part)), "no pair with and without: {sentence}");
                unheard.retain(|part| !sentence.contains(part));
            }
        }
    }
    assert!(unheard.is_empty(), "no longer said by --explain: {unheard:?}");
}

/// What Callgrind counts in the case `name`.
fn count(name: &str) -> u64 {
    let program = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", COUNTED])
        .arg(program)
        .args(["--count", name])
        .output()
        .unwrap_or_else(|e| panic!("valgrind does not start: {e}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {said}");
    let collected = said.lines().find_map(|line| line.split_once("Collected : ")?.1.parse().ok());
    collected.filter(|count| *count > 0).unwrap_or_else(|| panic!("{name}: nothing was counted: {said}"))
}

fn main() {
    let mut cases = cases();
    let savings = savings();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, wanted] = &arguments[..]
        && flag == "--count"
    {
        for Saving { name, with, without, .. } in savings {
            cases.extend([(format!("with {name}"), with), (format!("without {name}"), without)]);
        }
        let (_, case) = cases.into_iter().find(|(name, _)| name == wanted).unwrap_or_else(|| panic!("no {wanted}"));
        return case();
    }
    assert_complete(&savings);
    if arguments.iter().any(|argument| argument == "--complete") {
        return;
    }
    println!("{:44}{:>14}", "request", "instructions");
    for (name, _) in cases {
        println!("{name:44}{:>14}", count(&name));
    }
    println!("\n{:30}{:>14}{:>14}{:>14}", "saving", "with", "without", "without/with");
    for Saving { name, .. } in savings {
        let (with, without) = (count(&format!("with {name}")), count(&format!("without {name}")));
        println!("{name:30}{with:>14}{without:>14}{:>14.3}", without as f64 / with as f64);
        assert!(with < without, "{name}: saves nothing");
    }
}
