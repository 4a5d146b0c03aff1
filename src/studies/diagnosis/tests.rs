#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use super::faulty::{
    Answering, Faulty, Staged, altered, answer, by_stages, exact, misnamed, misnamed_schemes, misnamed_slips, mistold,
};
use super::fixed_steps::is_short_of;
use super::hypotheses::{hypotheses, slips_of_scenes};
use super::numbers::of_numbers;
use super::*;
use crate::integrators::{Boundaries, CentralDifference, Detail, Flight, Integrator, Taylor, VelocityAt};
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
        assert_eq!(found.verdict, Verdict::Passed, "{seed}: {:?}", found.causes);
        assert!(found.counts.asked > 200 && found.causes.is_empty());
    }
}

#[test]
fn every_fault_that_is_known_is_named() {
    let (tried, missed) = misnamed(1, 60, 1);
    assert!(tried > 100 && missed.is_empty(), "{} of {tried} missed:\n{}", missed.len(), missed.join("\n"));
}

#[test]
fn every_slip_in_a_formula_of_the_scene_is_named() {
    let (tried, mut missed) = misnamed_slips(1, 60);
    // What is left out has an older name.
    missed.retain(|text| !text.contains(" is left out: "));
    assert!(tried > 400 && missed.is_empty(), "{} of {tried} missed:\n{}", missed.len(), missed.join("\n"));
}

#[test]
fn every_solver_is_told_what_is_written_beside_it() {
    let (tried, missed) = mistold(usize::MAX);
    assert!(tried > 70 && missed.is_empty(), "{} of {tried}:\n{}", missed.len(), missed.join("\n"));
}

#[test]
fn numbers_of_single_precision_and_of_few_digits_are_seen() {
    let exact: Vec<f64> = (1..40).map(|i| f64::from(i).sqrt()).collect();
    let id = |numbers: Vec<f64>| of_numbers(numbers).map(|(id, _)| id);
    assert_eq!(id(exact.clone()), None);
    assert_eq!(id(exact.iter().map(|x| f64::from(*x as f32)).collect()), Some("single-precision"));
    let printed = |digits: usize| exact.iter().map(|x| format!("{x:.digits$e}").parse().unwrap()).collect();
    assert_eq!(id(printed(6)), Some("few-digits"));
    assert_eq!(id(printed(14)), None);
    let cut = |decimals: i32, size: f64| {
        let grain = 10.0_f64.powi(decimals);
        of_numbers(exact.iter().map(|x| (size * x * x * x * grain).round() / grain).collect()).map(|(_, what)| what)
    };
    assert_eq!(cut(6, 1.0).as_deref(), Some("is printed with at most 6 decimals"));
    assert_eq!(cut(9, 1e-3).as_deref(), Some("is printed with at most 9 decimals"));
    assert_eq!(cut(9, 1e4), None);
}

/// What is found of `solver` by the questions of `plan`.
fn diagnosed(mut solver: Answering, plan: Plan) -> Diagnosis {
    diagnose(&mut solver, plan, &|_, _| {})
}

/// Exact for another problem than the one asked, in a way that no hypothesis knows.
fn strange(fault: fn(&mut Problem)) -> Answering {
    altered(fault, |_, _| ())
}

#[test]
fn places_of_their_own_in_every_answer_are_never_certain() {
    let faults: [fn(&mut Problem); 2] = [
        |problem| problem.exit_depth *= 1.0 - 0.2 * problem.impact_speed.sin().abs(),
        |problem| problem.exit_depth *= 1.0 + 0.2 * problem.impact_speed.sin().abs(),
    ];
    for fault in faults {
        let found = diagnosed(strange(fault), Plan::default());
        assert_eq!(found.verdict, Verdict::Failed);
        assert!(!found.causes.iter().any(|cause| cause.certainty == Certainty::Certain), "{:?}", found.causes);
    }
}

#[test]
fn an_exit_at_little_speed_that_is_called_a_stop_fails() {
    for part in [1e-3, 1e-4] {
        for seed in 1..=4 {
            let stopping = Answering::plain(move |request| {
                let problem = request.problem(None);
                let Flight { mut outcome, mut end, .. } = exact(&problem)?;
                if end.velocity < part * problem.impact_speed {
                    outcome = Outcome::Stopped;
                    end.velocity = 0.0;
                }
                Some(answer(outcome, end))
            });
            let found = diagnosed(stopping, Plan { seed, ..Plan::default() });
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
            let found = diagnosed(strange(cap), Plan { seed, ..Plan::default() });
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
    for hypothesis in hypotheses().chain(slips_of_scenes()) {
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
    let found = diagnosed(strange(drop), Plan { asks_edges: false, ..Plan::default() });
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
    let found = diagnosed(strange(stiffer), Plan { asks_edges: false, ..Plan::default() });
    assert_eq!(found.verdict, Verdict::Failed);
    assert!(!found.causes[0].id.starts_with("tolerance"), "{:?}", found.causes);
}

/// A rest is found before the exit in the step that holds both: an exit at little speed is missed, at another one in each flight.
#[test]
fn a_threshold_that_fits_by_chance_is_never_certain() {
    for seed in 1..=8 {
        let hasty = Answering::plain(|request| {
            let problem = request.problem(None);
            let flight = exact(&problem)?;
            let endless = exact(&Problem { exit_depth: f64::INFINITY, ..problem.clone() });
            let rest = endless.filter(|rest| rest.end.time < 1.05 * flight.end.time);
            Some(match rest {
                Some(rest) if flight.end.velocity > 0.0 => answer(Outcome::Stopped, rest.end),
                _ => answer(flight.outcome, flight.end),
            })
        });
        let found = diagnosed(hasty, Plan { seed, ..Plan::default() });
        let is_certain = found.causes.iter().any(|cause| cause.certainty == Certainty::Certain);
        assert!(found.verdict == Verdict::Failed && !is_certain, "{seed}: {:?}", found.causes);
    }
}

#[test]
fn what_is_wrong_in_part_of_the_stages_of_a_kind_is_told_as_possible() {
    let in_part = by_stages(|Staged { alone, .. }, end| {
        let law = alone.stages[0];
        if law.viscosity > 0.0 && law.stiffness > 0.0 && (1e3 * alone.impact_speed).sin() > 0.0 {
            end.time *= 1.01;
            end.velocity *= 0.99;
        }
    });
    let found = diagnosed(in_part, Plan { asks_edges: false, ..Plan::default() });
    let cause = found.causes.iter().find(|cause| cause.id == "stage-wrong").unwrap();
    assert_eq!(cause.certainty, Certainty::Possible, "{cause:?}");
    assert!(cause.statement.contains("in part of those where it has a spring and it has viscosity"), "{cause:?}");
}

#[test]
fn a_sum_in_single_precision_is_found_though_every_limit_looks_right() {
    for seed in 1..=4 {
        let forgetful = Answering::plain(|request| {
            let step = request.dt_s?;
            let scheme = CentralDifference::uniform(step, VelocityAt::PredictedHalfStep, Boundaries::Landed);
            let Flight { outcome, mut end, .. } = scheme.solve(&request.problem(None), Detail::End).ok()?;
            let steps = (end.time / step) as usize;
            let sum = (0..steps).fold(0.0_f32, |sum, _| sum + step as f32);
            end.time += f64::from(sum) - steps as f64 * step;
            Some(answer(outcome, end))
        })
        .in_fixed_steps();
        let found = diagnosed(forgetful, Plan { seed, ..Plan::default() });
        assert_eq!(found.verdict, Verdict::Failed, "seed {seed}: {:?} {:?}", found.counts, found.causes);
    }
}

#[test]
fn an_error_at_the_loose_tolerances_alone_fails() {
    let loose = Answering::plain(|request| {
        let mut problem = request.problem(None);
        problem.stages.iter_mut().filter(|_| request.rtol > 1e-7).for_each(|law| law.drag *= 0.9);
        exact(&problem).map(|flight| answer(flight.outcome, flight.end))
    });
    let found = diagnosed(loose, Plan { questions: 60, asks_edges: false, ..Plan::default() });
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
fn a_number_that_is_kept_of_a_target_with_another_speed_or_mass_fails() {
    for seed in 1..=4 {
        // The crater of a target is kept from its first scene.
        let caching = Answering::new(|| {
            let mut known = Vec::<(Vec<Stage>, Stage)>::new();
            move |request: &PeerRequest| {
                let mut problem = request.problem(None);
                let target = problem.stages[1..].to_vec();
                match known.iter().find(|(known, _)| *known == target) {
                    _ if target.is_empty() => {}
                    Some((_, crater)) => problem.stages[0] = *crater,
                    None => known.push((target, problem.stages[0])),
                }
                exact(&problem).map(|flight| answer(flight.outcome, flight.end))
            }
        })
        .of_scenes();
        let found = diagnosed(caching, Plan { seed, ..Plan::default() });
        assert_eq!(found.verdict, Verdict::Failed, "seed {seed}");
        assert!(["input-kept", "state-kept"].contains(&found.causes[0].id.as_str()), "{:?}", found.causes);
    }
}

/// A projectile without speed answered as if it had some, and a drag that is wrong as well.
#[test]
fn a_projectile_without_speed_is_judged_by_itself() {
    let found_by = |drag: f64| {
        let solver = Answering::plain(move |request| {
            let mut problem = request.problem(None);
            problem.stages.iter_mut().for_each(|law| law.drag *= drag);
            let flight = exact(&problem)?;
            let is_still = request.velocity_m_s == 0.0;
            let end = if is_still { State { time: 1e-3, depth: -1e-3, velocity: 0.0 } } else { flight.end };
            Some(answer(flight.outcome, end))
        });
        diagnosed(solver, Plan::default())
    };
    let ids = |found: &Diagnosis| found.causes.iter().map(|cause| cause.id.clone()).collect::<Vec<_>>();
    let alone = found_by(1.0);
    assert_eq!((alone.verdict, &ids(&alone)[..]), (Verdict::Failed, &["no-speed".to_owned()][..]));
    let both = found_by(1.5);
    assert!(ids(&both)[0] == "term:drag" && both.causes[0].certainty == Certainty::Certain, "{:?}", both.causes);
}

/// The whole of a first stage that the flight does not leave has the force of the second one.
#[test]
fn a_force_that_is_wrong_throughout_a_stage_is_not_told_as_one_of_a_single_step() {
    let wrong: fn(&mut Problem) = |problem| {
        if let [first, second, ..] = &mut problem.stages[..]
            && problem.exit_depth <= first.end
        {
            *first = Stage { end: first.end, ..*second };
        }
    };
    let found = diagnosed(strange(wrong), Plan { asks_edges: false, ..Plan::default() });
    let first = &found.causes[0];
    assert!(found.verdict == Verdict::Failed && first.id != "force-stale", "{:?}", found.causes);
}
