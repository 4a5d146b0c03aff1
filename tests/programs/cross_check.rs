//! The live cross-check: the programs themselves are asked, and must still say what was recorded.
//!
//! Where Python 3 or the network for its packages is missing, the tests say so in one line and count as ignored; with
//! `CI=true` they fail, so that a build server cannot quietly check nothing.

use std::io::Write;
use std::process::{Command, Stdio};

use libtest_mimic::{Arguments, Trial};
use penetrode::exchange::peers::{
    BundledPeer, Environment, Peer, PeerRequest, PeerSetupError, RecordedFlight, Recording, recordings,
};
use penetrode::integrators::{ClosedForm, Detail, Integrator, Taylor};
use penetrode::physics::{Outcome, Problem, Stage};
use serde_json::{Value, json};

use crate::trials::{Check, Failure, ensure, required, trial};

/// A claim, the program that it needs, and how it is checked.
type Claim = (&'static str, BundledPeer, fn(BundledPeer, &Environment) -> Check);

const CLAIMS: [Claim; 11] = [
    ("cvode_adams_still_says_what_was_recorded", BundledPeer::SundaeAdams, says_what_was_recorded),
    ("cvode_bdf_still_says_what_was_recorded", BundledPeer::SundaeBdf, says_what_was_recorded),
    ("ida_still_says_what_was_recorded", BundledPeer::SundaeIda, says_what_was_recorded),
    ("heyoka_still_says_what_was_recorded", BundledPeer::Heyoka, says_what_was_recorded),
    ("cvode_with_coincident_events_answers_or_reports_and_lives", BundledPeer::SundaeAdams, survives_coincidence),
    ("scipy_with_the_natural_events_misses_a_perforation", BundledPeer::Scipy, misses_a_perforation),
    ("heyoka_times_itself_and_tells_the_spread", BundledPeer::Heyoka, times_itself),
    ("scipy_times_itself_and_tells_the_spread", BundledPeer::Scipy, times_itself),
    ("scikit_sundae_answers_hostile_lines_with_an_error_and_lives", BundledPeer::SundaeAdams, survives_hostile_lines),
    ("scipy_answers_hostile_lines_with_an_error_and_lives", BundledPeer::Scipy, survives_hostile_lines),
    ("heyoka_answers_hostile_lines_with_an_error_and_lives", BundledPeer::Heyoka, survives_hostile_lines),
];

pub(crate) fn trials(arguments: &Arguments) -> Vec<Trial> {
    let wanted = |name: &str| {
        let hit = |pattern: &String| if arguments.exact { name == pattern } else { name.contains(pattern.as_str()) };
        arguments.filter.as_ref().is_none_or(hit) && !arguments.skip.iter().any(hit)
    };
    let mut said = Vec::new();
    let mut trials = Vec::new();
    for (name, peer, check) in CLAIMS {
        // Neither a list nor tests that were not asked for are worth a download.
        if arguments.list || !wanted(name) {
            trials.push(trial(name, || Ok(())));
            continue;
        }
        trials.push(match Environment::ensure(peer, &mut |line| eprintln!("{line}")) {
            Ok(environment) => trial(name, move || check(peer, &environment)),
            Err(error) => {
                let reason = error.to_string();
                if !required() && !said.contains(&reason) {
                    eprintln!("cross-check ignored: {reason}");
                    said.push(reason.clone());
                }
                // Asked for all the same (`--ignored`), it fails: it cannot pass without having checked.
                trial(name, move || Err(reason.into())).with_ignored_flag(!required())
            }
        });
    }
    let name = "without_a_network_the_set_up_says_so_in_one_line_and_leaves_nothing";
    trials.push(trial(name, says_that_the_network_is_missing));
    trials
}

/// The same program at the same tolerance: on another machine only its rounding may differ.
fn says_what_was_recorded(peer: BundledPeer, environment: &Environment) -> Check {
    let recording = recording_of(peer)?;
    let mut live = Peer::start(&environment.command(peer))?;
    let identity = live.identity();
    ensure!(
        (&identity.name, &identity.version) == (&recording.program, &recording.version),
        "{identity} is not the program of the recording, {}",
        recording.version
    );
    for flight in &recording.flights {
        let answer = live.ask(&flight.request)?;
        let differences = answer
            .differences_from(&flight.answer.flight(&flight.problem()), &flight.problem())
            .ok_or_else(|| format!("{}: {} was {}", flight.scene, answer.outcome, flight.answer.outcome))?;
        ensure!(
            answer.events.len() == flight.answer.events.len(),
            "{}: {:?} were {:?}",
            flight.scene,
            answer.events,
            flight.answer.events
        );
        for difference in differences {
            ensure!(difference.relative <= 1e-10 * difference.conditioning, "{}: {difference:?}", flight.scene);
        }
        // And ours: two unlike methods agree within what the program is trusted to.
        let ours = Taylor::default().solve(&flight.problem(), Detail::Events)?;
        let differences = answer
            .differences_from(&ours, &flight.problem())
            .ok_or_else(|| format!("{}: {} is {} by the Taylor series", flight.scene, answer.outcome, ours.outcome))?;
        for difference in differences {
            ensure!(
                difference.relative <= recording.trusted_to() * difference.conditioning,
                "{} against the Taylor series: {difference:?}",
                flight.scene
            );
        }
    }
    Ok(())
}

/// The numbers of a timed answer are those of an untimed one, and its quartiles enclose the median.
fn times_itself(peer: BundledPeer, environment: &Environment) -> Check {
    let request = flight("perforate")?.request;
    for options in if peer == BundledPeer::Heyoka { &["", " --lanes 4"][..] } else { &[""] } {
        let mut live = Peer::start(&format!("{}{options}", environment.command(peer)))?;
        let (plain, timed) = (live.ask(&request)?, live.ask(&PeerRequest { repeats: 20, ..request.clone() })?);
        ensure!(
            !((plain.depth_m, plain.time_s, plain.velocity_m_s) != (timed.depth_m, timed.time_s, timed.velocity_m_s)),
            "{timed:?} is not {plain:?}"
        );
        let (Some(median), Some([low, high])) = (timed.wall_ns, timed.wall_ns_quartiles) else {
            return Err(format!("no time or no spread: {timed:?}").into());
        };
        ensure!(
            !(!(0.0 < low && low <= median && median <= high) || plain.wall_ns_quartiles.is_some()),
            "{low} .. {median} .. {high} ns"
        );
    }
    Ok(())
}

/// H = k d and rest there, within 1e-12 and 1e-6: SUNDIALS may refuse ("root found at and very near"), and must then
/// be heard saying so, and answer the next question.
fn survives_coincidence(peer: BundledPeer, environment: &Environment) -> Check {
    let tunnel = flight("tunnel")?;
    let mut request = tunnel.request;
    let (crater_end, stiffness) = (0.1, 1e7);
    request.stages[0].stiffness = stiffness;
    request.exit_depth_m = Some(crater_end);
    let critical = crater_end * f64::sqrt(stiffness / request.mass_kg);
    let mut live = Peer::start(&environment.command(peer))?;
    for offset in [0.0, 1e-12, -1e-12, 1e-6, -1e-6] {
        request.velocity_m_s = critical * (1.0 + offset);
        match live.ask(&request) {
            Ok(answer) if offset.abs() < 1e-9 || (answer.outcome == Outcome::Perforated) == (offset > 0.0) => {}
            Ok(answer) => return Err(format!("offset {offset}: {answer:?}").into()),
            Err(failure) if failure.is_reported() => {}
            Err(failure) => return Err(failure.into()),
        }
    }
    Ok(())
}

/// The fault that this peer is kept for: with the natural events {x = H, V = 0} a step jumps over the turning point,
/// sees x < H at both ends, and calls a perforation with half of the way to rest still before it a stop.
fn misses_a_perforation(peer: BundledPeer, environment: &Environment) -> Check {
    // The tunnel scene without drag: a constant force, integrated exactly, so that error estimates vanish.
    let force = 848_230.0;
    let crater = Some(Stage::crater(force / 0.1, 0.1));
    let problem = Problem::crater_and_tunnel(2.0, 300.0, crater, Stage::tunnel(force, 0.0)).with_exit(0.128);
    let exact = ClosedForm.solve(&problem, Detail::Events)?;
    let mut live = Peer::start(&environment.command(peer))?;
    let missed = live.ask(&PeerRequest::from_problem(&problem, 1e-12))?;
    let is_missed = missed.outcome.is_stop() && missed.depth_m > 1.1 * exact.end.depth;
    ensure!(
        is_missed && exact.outcome == Outcome::Perforated,
        "it is expected to call a stop beyond the exit depth, and answers {missed:?}"
    );
    Ok(())
}

/// The peers are asked over the same protocol by other people's tools, which make mistakes.
fn survives_hostile_lines(peer: BundledPeer, environment: &Environment) -> Check {
    let good = serde_json::to_value(flight("tunnel")?.request)?;
    let with = |key: &str, value: Value| {
        let mut request = good.clone();
        request["id"] = json!(7);
        request[key] = value;
        request.to_string()
    };
    let nan = with("mass_kg", json!("nan")).replace("\"nan\"", "NaN");
    let rising = json!([{"static_force_n": 1, "stiffness_n_m": 0, "viscosity_kg_s": 0, "drag_kg_m": 0, "end_m": 1}]);
    let free = json!([{"static_force_n": 0, "stiffness_n_m": 0, "viscosity_kg_s": 0, "drag_kg_m": 0, "end_m": null}]);
    let hostile = [
        "garbage".to_owned(),
        "[]".to_owned(),
        "{}".to_owned(),
        "[".repeat(30_000),
        nan,
        with("mass_kg", json!(-1)),
        with("mass_kg", json!("2 kg")),
        with("velocity_m_s", json!(true)),
        with("rtol", json!(0)),
        with("atol", json!([1e-9])),
        with("repeats", json!(0)),
        with("stages", json!([])),
        with("stages", json!([1])),
        with("stages", rising),
        with("stages", free),
    ];
    let asked: Vec<_> = hostile.iter().cloned().chain([with("repeats", json!(2))]).collect();
    let words = shlex::split(&environment.command(peer)).ok_or("the command cannot be split")?;
    let mut child = Command::new(&words[0]).args(&words[1..]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    // All of this fits into the pipes, so nobody waits for the other; the end of its input ends the peer.
    child.stdin.take().ok_or("no pipe")?.write_all((asked.join("\n") + "\n").as_bytes())?;
    let output = child.wait_with_output()?;
    let answers = output.stdout.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
    let answers = answers.map(serde_json::from_slice).collect::<Result<Vec<Value>, _>>()?;
    ensure!(
        answers.len() == asked.len() && output.status.success(),
        "{} answers to {} lines, {}",
        answers.len(),
        asked.len(),
        output.status
    );
    for (line, answer) in hostile.iter().zip(&answers) {
        let is_refused = answer["error"].as_str().is_some_and(|cause| !cause.is_empty());
        ensure!(is_refused, "{line:.200} is answered with {answer}");
    }
    let last = &answers[hostile.len()];
    ensure!(
        !(last["id"] != json!(7) || !last["depth_m"].is_f64() || !last["wall_ns"].is_number()),
        "the request after them is answered with {last}"
    );
    Ok(())
}

fn says_that_the_network_is_missing() -> Check {
    let cache = tempfile::tempdir()?;
    // Port 9 of this machine answers nobody.
    let unreachable = "--index-url http://127.0.0.1:9/simple\nno-such-package==1.0\n";
    match Environment::ensure_in(cache.path(), "python3", unreachable, &mut |_| ()) {
        Err(error @ PeerSetupError::NoPackages(_)) => {
            let left: Vec<_> = std::fs::read_dir(cache.path())?.filter_map(Result::ok).map(|e| e.file_name()).collect();
            let message = error.to_string();
            ensure!(
                !(message.contains('\n') || left.iter().any(|name| !name.to_string_lossy().starts_with("scripts-"))),
                "{message:?} and {left:?}"
            );
            Ok(())
        }
        // Without Python there is nothing to install from; the other tests say so.
        Err(PeerSetupError::NoPython { .. } | PeerSetupError::NoVirtualEnvironment(_)) => Ok(()),
        other => Err(format!("{other:?}").into()),
    }
}

fn recording_of(peer: BundledPeer) -> Result<Recording, Failure> {
    let command = format!("python3 verification/peers/{}", peer.arguments().join(" "));
    let found = recordings()?.into_iter().find(|recording| recording.command == command);
    found.ok_or_else(|| format!("no recording of `{command}`").into())
}

fn flight(scene: &str) -> Result<RecordedFlight, Failure> {
    let recording = recording_of(BundledPeer::SundaeAdams)?;
    let found = recording.flights.into_iter().find(|flight| flight.scene == scene);
    found.ok_or_else(|| format!("no scene `{scene}`").into())
}
