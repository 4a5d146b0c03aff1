#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::sync::atomic::{AtomicU32, Ordering};

use super::faulty::{Faulty, answer, failure, misnamed, misnamed_schemes};
use super::fixed_steps::is_short_of;
use super::hypotheses::hypotheses;
use super::numbers::of_numbers;
use super::*;
use crate::integrators::{Boundaries, CentralDifference, Detail, Integrator, Solved, Taylor, VelocityAt};
use crate::physics::{Problem, Stage};

/// The questions of `seed`, those at the edges among them.
fn all_questions(seed: u64) -> Vec<Question> {
    let mut all = questions(seed, Plan::default().questions, false);
    all.extend(edge_questions());
    in_order(&mut all);
    all
}

#[test]
fn a_right_solver_is_sound_and_has_no_cause() {
    for seed in 1..=3 {
        let found = Faulty::new(Vec::new(), &all_questions(seed)).diagnosed();
        assert_eq!(found.verdict, Verdict::Passed);
        assert!(found.counts.asked > 200 && found.causes.is_empty());
    }
}

#[test]
fn every_fault_that_is_known_is_named() {
    let (tried, missed) = misnamed(1, 60, 1);
    assert!(tried > 100 && missed.is_empty(), "{} of {tried} missed:\n{}", missed.len(), missed.join("\n"));
}

#[test]
fn two_faults_at_once_are_both_named() {
    let of = |id: &str| hypotheses().find(|hypothesis| hypothesis.id == id).unwrap();
    let faults = vec![(of("term:drag"), 0.5), (of("unit:time"), 1e3)];
    let found = Faulty::new(faults, &all_questions(1)).diagnosed();
    let named: Vec<_> = found.causes.iter().map(|cause| (cause.id.as_str(), cause.certainty)).collect();
    assert_eq!(named, [("term:drag", Certainty::Certain), ("unit:time", Certainty::Certain)]);
}

#[test]
fn numbers_of_single_precision_and_of_few_digits_are_seen() {
    let exact: Vec<f64> = (1..40).map(|i| f64::from(i).sqrt()).collect();
    let id = |numbers: Vec<f64>| of_numbers("number", &numbers, 3).map(|cause| cause.id);
    assert_eq!(id(exact.clone()), None);
    assert_eq!(id(exact.iter().map(|x| f64::from(*x as f32)).collect()).as_deref(), Some("single-precision"));
    let printed = |digits: usize| exact.iter().map(|x| format!("{x:.digits$e}").parse().unwrap()).collect();
    assert_eq!(id(printed(6)).as_deref(), Some("few-digits"));
    assert_eq!(id(printed(14)), None);
}

/// A solver with a state that it has anew when it is started again.
struct Made<S> {
    identity: PeerIdentity,
    at_start: S,
    state: S,
    solve: fn(&mut S, &PeerRequest) -> Solved,
}

impl<S: Clone> Made<S> {
    fn new(at_start: S, solve: fn(&mut S, &PeerRequest) -> Solved) -> Self {
        let identity = PeerIdentity { name: "made".to_owned(), ..PeerIdentity::default() };
        Self { identity, state: at_start.clone(), at_start, solve }
    }

    /// What is found of it by the questions of `plan`.
    fn diagnosed(mut self, plan: Plan) -> Diagnosis {
        diagnose(&mut self, plan, &|_, _| {})
    }
}

impl<S: Clone> Solver for Made<S> {
    fn identity(&self) -> PeerIdentity {
        self.identity.clone()
    }

    fn command(&self) -> String {
        "made".to_owned()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        let flight = (self.solve)(&mut self.state, request).map_err(|error| failure(&error.to_string()))?;
        Ok(answer(flight.outcome, flight.end))
    }

    fn restart(&mut self) -> bool {
        self.state = self.at_start.clone();
        true
    }
}

/// The exact flight through `problem`.
fn exact(problem: &Problem) -> Solved {
    Taylor::default().solve(problem, Detail::End)
}

/// Exact for another problem than the one asked, in a way that no hypothesis knows.
fn strange(fault: fn(&mut Problem)) -> Made<fn(&mut Problem)> {
    Made::new(fault, |fault, request| {
        let mut problem = request.problem(None);
        fault(&mut problem);
        exact(&problem)
    })
}

#[test]
fn a_fault_that_no_hypothesis_knows_is_found_and_not_named_with_certainty() {
    let faults: [fn(&mut Problem); 3] = [
        |problem| problem.stages.iter_mut().filter(|law| law.static_force < 0.0).for_each(|law| law.drag = 0.0),
        |problem| {
            let mass = problem.mass;
            problem.stages.iter_mut().filter(|law| law.viscosity < mass).for_each(|law| law.viscosity = 0.0);
        },
        |problem| problem.stages[0].static_force *= 1.0 + 1e-3 * problem.impact_speed,
    ];
    let mut told = 0;
    for fault in faults {
        let plan = Plan { asks_edges: false, ..Plan::default() };
        let found = strange(fault).diagnosed(plan);
        assert_eq!(found.verdict, Verdict::Failed);
        let is_certain = |cause: &Cause| cause.certainty == Certainty::Certain;
        assert!(!found.causes.iter().any(is_certain), "{:?}", found.causes);
        assert_eq!(found.causes[0].id, "unknown");
        let separation = found.separation.unwrap();
        // What tells them apart stands in more of the failing questions.
        if let Some((_, shares)) = separation.split_once("stands in ") {
            let shares: Vec<u32> = shares.split(' ').filter_map(|word| word.parse().ok()).collect();
            assert!(shares.len() == 2 && shares[0] > shares[1], "{separation}");
            told += 1;
        }
    }
    assert!(told > 0);
}

/// The exit lies elsewhere in every question, too near or too deep.
#[test]
fn places_of_their_own_in_every_answer_are_never_certain() {
    let faults: [fn(&mut Problem); 2] = [
        |problem| problem.exit_depth *= 1.0 - 0.2 * problem.impact_speed.sin().abs(),
        |problem| problem.exit_depth *= 1.0 + 0.2 * problem.impact_speed.sin().abs(),
    ];
    for fault in faults {
        let found = strange(fault).diagnosed(Plan::default());
        assert_eq!(found.verdict, Verdict::Failed);
        assert!(!found.causes.iter().any(|cause| cause.certainty == Certainty::Certain), "{:?}", found.causes);
    }
}

#[test]
fn an_exit_at_little_speed_that_is_called_a_stop_fails() {
    for part in [1e-3, 1e-4] {
        for seed in 1..=4 {
            let stopping = Made::new(part, |part, request| {
                let problem = request.problem(None);
                let mut flight = exact(&problem)?;
                if flight.end.velocity < *part * problem.impact_speed {
                    flight.outcome = Outcome::Stopped;
                    flight.end.velocity = 0.0;
                }
                Ok(flight)
            });
            let found = stopping.diagnosed(Plan { seed, ..Plan::default() });
            assert_eq!((found.verdict, found.counts.undecided), (Verdict::Failed, 0), "{part} by seed {seed}");
        }
    }
}

/// Exact, but for flights deeper than 10 m or longer than 10 s: few questions are.
#[test]
fn a_cap_on_depth_or_on_time_fails_by_every_seed() {
    let caps: [fn(&mut Problem); 3] = [
        |problem| problem.exit_depth = problem.exit_depth.min(10.0),
        // None that is asked for is one there.
        |problem| {
            if !problem.has_exit() {
                problem.exit_depth = 10.0;
            }
        },
        |problem| {
            let time = Taylor::default().solve(problem, Detail::End).unwrap().end.time;
            problem.mass *= (10.0 / time).min(1.0);
        },
    ];
    for (index, cap) in caps.into_iter().enumerate() {
        for seed in 1..=4 {
            let found = strange(cap).diagnosed(Plan { seed, ..Plan::default() });
            assert_eq!(found.verdict, Verdict::Failed, "{index} by seed {seed}");
        }
    }
}

#[test]
fn a_factor_near_one_is_shown_with_the_digits_that_tell_it_from_one() {
    let drag = hypotheses().find(|hypothesis| hypothesis.id == "term:drag").unwrap();
    assert_eq!(drag.says(1.0 + 1e-7), "the drag q is 1.00000010000 times the right one");
    assert_eq!(drag.says(2.0), "the drag q is 2 times the right one");
    assert_eq!(drag.says(0.0), "the drag q is left out");
}

#[test]
fn schemes_of_fixed_steps_are_sound_and_named_and_a_fault_in_one_with_its_factor() {
    let (tried, missed) = misnamed_schemes(1, Plan::default().questions);
    assert!(tried == 12 && missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn every_cause_has_its_row_in_the_reference() {
    let reference = include_str!("../../../docs/reference.md");
    for hypothesis in hypotheses() {
        // Parameters stand in one row, the first with its prefix.
        let id = hypothesis.id.strip_prefix("parameter:").unwrap_or(hypothesis.id);
        let is_there = reference.contains(&format!("`{id}`")) || reference.contains(&format!("`parameter:{id}`"));
        assert!(is_there, "{}", hypothesis.id);
    }
}

/// Exact, but for terms that are small beside the others: they are left out.
#[test]
fn a_term_that_is_dropped_where_it_is_small_is_found() {
    let drop: fn(&mut Problem) = |problem| {
        let speed = problem.impact_speed;
        for law in &mut problem.stages {
            if law.viscosity * speed < 1e-2 * law.static_force {
                law.viscosity = 0.0;
            }
        }
    };
    let found = strange(drop).diagnosed(Plan { asks_edges: false, ..Plan::default() });
    assert_eq!(found.verdict, Verdict::Failed);
}

/// Exact, but for a spring that is a little too stiff in one stage: no matter of the tolerance.
#[test]
fn a_small_fault_in_few_answers_is_not_taken_for_inaccuracy() {
    let stiffer: fn(&mut Problem) = |problem| {
        if let Some(law) = problem.stages.get_mut(1) {
            law.stiffness *= 1.001;
        }
    };
    let found = strange(stiffer).diagnosed(Plan { asks_edges: false, ..Plan::default() });
    assert_eq!(found.verdict, Verdict::Failed);
    assert!(!found.causes[0].id.starts_with("tolerance"), "{:?}", found.causes);
}

#[test]
fn a_sum_in_single_precision_is_found_though_every_limit_looks_right() {
    for seed in 1..=4 {
        let mut forgetful = Made::new((), |(), request| {
            let step = request.dt_s.unwrap();
            let scheme = CentralDifference::uniform(step, VelocityAt::PredictedHalfStep, Boundaries::Landed);
            let mut flight = scheme.solve(&request.problem(None), Detail::End)?;
            let steps = (flight.end.time / step) as usize;
            let sum = (0..steps).fold(0.0_f32, |sum, _| sum + step as f32);
            flight.end.time += f64::from(sum) - steps as f64 * step;
            Ok(flight)
        });
        forgetful.identity.fixed_step = true;
        let found = forgetful.diagnosed(Plan { seed, ..Plan::default() });
        assert_eq!(found.verdict, Verdict::Failed, "seed {seed}: {:?} {:?}", found.counts, found.causes);
    }
}

/// Errors of 3e-10 at every tolerance below 1e-8 are allowed at 1e-12, and no tolerance of that solver lessens them.
#[test]
fn a_tolerance_that_is_kept_to_a_floor_alone_is_sound_and_told() {
    let floored = Made::new((), |(), request| {
        let mut flight = exact(&request.problem(None))?;
        flight.end.time *= 1.0 + 0.03 * request.rtol.max(1e-8);
        Ok(flight)
    });
    let found = floored.diagnosed(Plan { asks_edges: false, ..Plan::default() });
    assert_eq!((found.verdict, found.causes.len()), (Verdict::Passed, 1), "{:?}", found.causes);
    let cause = &found.causes[0];
    assert!(
        cause.id == "tolerance-ignored" && cause.statement.contains("the same, with errors up to 3e-10"),
        "{cause:?}"
    );
}

#[test]
fn errors_of_many_tolerances_that_fall_with_them_are_no_floor() {
    let coarse = Made::new((), |(), request| {
        let mut flight = exact(&request.problem(None))?;
        flight.end.time *= 1.0 + 100.0 * request.rtol;
        Ok(flight)
    });
    let found = coarse.diagnosed(Plan { asks_edges: false, ..Plan::default() });
    assert!(found.verdict == Verdict::Passed && found.causes.is_empty(), "{:?}", found.causes);
}

#[test]
fn an_error_at_the_loose_tolerances_alone_fails() {
    let loose = Made::new((), |(), request| {
        let mut problem = request.problem(None);
        problem.stages.iter_mut().filter(|_| request.rtol > 1e-7).for_each(|law| law.drag *= 0.9);
        exact(&problem)
    });
    let found = loose.diagnosed(Plan { asks_edges: false, ..Plan::default() });
    let failing: Vec<_> = found.questions.iter().filter(|asked| asked.verdict == Verdict::Failed).collect();
    assert_eq!(found.verdict, Verdict::Failed);
    assert!(!failing.is_empty() && failing.iter().all(|asked| asked.rtol > Some(1e-7)));
}

#[test]
fn an_order_falls_short_only_where_its_whole_interval_and_the_smallest_steps_do() {
    assert!(is_short_of(2.0, [1.5, 1.69], Some(1.6)));
    assert!(!is_short_of(2.0, [1.5, 1.71], Some(1.6)));
    assert!(!is_short_of(2.0, [1.5, 1.69], Some(1.8)));
    assert!(!is_short_of(2.0, [1.5, 1.69], None));
}

#[test]
fn what_a_solver_keeps_of_earlier_questions_is_found_by_starting_it_again() {
    // The clock goes on from the last exit.
    let running = Made::new(0.0, |clock, request| {
        let mut flight = exact(&request.problem(None))?;
        flight.end.time += *clock;
        *clock = if flight.end.velocity > 0.0 { flight.end.time } else { 0.0 };
        Ok(flight)
    });
    let found = running.diagnosed(Plan::default());
    assert_eq!((found.verdict, found.causes[0].id.as_str()), (Verdict::Failed, "state-kept"), "{:?}", found.causes);
    assert_eq!(found.causes[0].certainty, Certainty::Certain);
}

#[test]
fn a_number_that_is_kept_of_a_target_with_another_speed_or_mass_fails() {
    for seed in 1..=4 {
        // The crater of a target is kept from its first scene.
        let mut caching = Made::new(Vec::<(Vec<Stage>, Stage)>::new(), |known, request| {
            let mut problem = request.problem(None);
            let target = problem.stages[1..].to_vec();
            match known.iter().find(|(known, _)| *known == target) {
                _ if target.is_empty() => {}
                Some((_, crater)) => problem.stages[0] = *crater,
                None => known.push((target, problem.stages[0])),
            }
            exact(&problem)
        });
        caching.identity.reads_scene = true;
        let found = caching.diagnosed(Plan { seed, ..Plan::default() });
        assert_eq!(found.verdict, Verdict::Failed, "seed {seed}");
        assert!(["input-kept", "state-kept"].contains(&found.causes[0].id.as_str()), "{:?}", found.causes);
    }
}

/// Of its own numbers, since the table of hypotheses is measured by itself elsewhere.
#[test]
fn an_s_of_another_formula_is_named_of_a_reader_of_scenes() {
    let mut other = Made::new((), |(), request| {
        let scene = request.scene.as_ref().unwrap();
        let s = scene.static_factor.unwrap_or_else(|| 82.6 * (scene.strength_pa * 1e-6).powf(-0.544));
        let thickness = scene.thickness_m.map_or_else(String::new, |h| format!("target.thickness = {h:?}"));
        let stiffness =
            scene.crater_stiffness_n_m.map_or_else(String::new, |c| format!("resistance.crater_stiffness = {c:?}"));
        let text = format!(
            "projectile.mass = {:?}\nprojectile.diameter = {:?}\nprojectile.nose.factor = {:?}\ntarget.strength = {:?}\n\
             target.density = {:?}\nresistance.S = {s:?}\nresistance.B = {:?}\nresistance.k = {:?}\n\
             impact.velocity = {:?}\nperforation.criterion = \"{}\"\n{thickness}\n{stiffness}\n",
            scene.mass_kg,
            scene.diameter_m,
            scene.nose_factor,
            scene.strength_pa,
            scene.density_kg_m3,
            scene.inertia_factor,
            scene.crater_ratio,
            scene.velocity_m_s,
            scene.criterion,
        );
        exact(&Scene::from_toml(&text, "asked").unwrap().problem().unwrap())
    });
    other.identity.reads_scene = true;
    let found = other.diagnosed(Plan::default());
    let first = &found.causes[0];
    let is_named = first.id == "parameter:S" && first.certainty == Certainty::Certain;
    assert!(is_named && first.statement.contains("82.6 (fc/MPa)^-0.544"), "{first:?}");
}

#[test]
fn a_solver_that_answers_otherwise_each_time_is_told_so() {
    static ASKED: AtomicU32 = AtomicU32::new(1);
    let noisy = Made::new((), |(), request| {
        let mut flight = exact(&request.problem(None))?;
        flight.end.time *= 1.0 + 1e-3 * f64::from(ASKED.fetch_add(1, Ordering::Relaxed)).sin();
        Ok(flight)
    });
    let found = noisy.diagnosed(Plan { asks_edges: false, ..Plan::default() });
    assert_eq!((found.verdict, found.causes[0].id.as_str()), (Verdict::Failed, "not-repeatable"), "{:?}", found.causes);
}
