//! The scheme against its exact discrete solution, its error constants, its events and its refusals.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use smallvec::smallvec;

use super::stability::{PART_OF_LIMIT, cannot_end};
use super::*;
use crate::integrators::ClosedForm;
use crate::integrators::outcome::Sample;
use crate::physics::Advice;
use crate::physics::{EventKind, Outcome, Stage, Stages, Target};
use crate::testing::{continuous, kinds, stage};

const INF: f64 = f64::INFINITY;

/// Mass (kg), static strength P (N), drag Q (kg/m) and crater depth k d (m) of a 50 mm projectile in concrete
/// of 36 N/mm², at V0 (m/s).
const MASS: f64 = 2.0;
const STRENGTH: f64 = 848_230.0;
pub(crate) const DRAG: f64 = 3.2515;
const CRATER_DEPTH: f64 = 0.1;
pub(crate) const SPEED: f64 = 300.0;

fn stages(list: Stages, speed: f64, exit_depth: f64) -> Problem {
    Problem::of_stages(MASS, speed, list).with_exit(exit_depth)
}

/// Stages without a far side, entered at [`SPEED`].
fn endless(list: &[Stage]) -> Problem {
    stages(list.iter().copied().collect(), SPEED, INF)
}

/// Crater and tunnel with drag `q`; the crater constant times `jump` of the continuous one.
pub(crate) fn concrete(q: f64, jump: f64, speed: f64, exit_depth: f64) -> Problem {
    let mut problem = continuous(MASS, STRENGTH, q, CRATER_DEPTH, speed, exit_depth);
    problem.stages[0].stiffness *= jump;
    problem
}

fn scheme(step: f64, velocity: VelocityAt, boundaries: Boundaries) -> CentralDifference {
    CentralDifference::uniform(step, velocity, boundaries)
}

/// The closed form of the end.
fn exact_end(problem: &Problem) -> State {
    ClosedForm.solve(problem, Detail::End).unwrap().end
}

/// `count` fractions spread evenly and without a common ratio: multiples of the golden section, modulo 1.
fn spread(count: u32) -> impl Iterator<Item = f64> {
    (1..=count).map(|i| (f64::from(i) * 0.618_033_988_749_894_8).fract())
}

/// Every combination of the rules.
pub(crate) fn combinations() -> impl Iterator<Item = (VelocityAt, Boundaries)> {
    VelocityAt::ALL
        .into_iter()
        .flat_map(|velocity| Boundaries::ALL.into_iter().map(move |boundaries| (velocity, boundaries)))
}

/// Every combination by which the place of an event is located within a step.
fn located() -> impl Iterator<Item = (VelocityAt, Boundaries)> {
    combinations().filter(|(_, boundaries)| *boundaries != Boundaries::StepEnd)
}

/// A crater without end, with w = `w` (1/s).
fn spring(w: f64) -> Problem {
    endless(&[stage(0.0, MASS * w * w, 0.0, 0.0, INF)])
}

#[test]
fn nodes_in_the_crater_are_the_exact_discrete_solution_for_every_velocity_rule() {
    // x(i) = V0 dt sin(i th)/sin(th), 2 sin(th/2) = w dt, over many swings: no event is looked for.
    let w = 2300.0;
    for velocity in VelocityAt::ALL {
        for (w_dt, limit) in [(1e-3, 1e-12), (0.1, 1e-12), (0.37, 1e-12), (1.0, 1e-12), (1.999_999, 4e-10)] {
            let step = w_dt / w;
            let states = scheme(step, velocity, Boundaries::StepEnd).free_states(&spring(w), 4001).unwrap();
            let theta = 2.0 * f64::asin(0.5 * w * step);
            let amplitude = SPEED * step / theta.sin();
            for (i, state) in states.iter().enumerate() {
                let error = (state.depth - amplitude * (i as f64 * theta).sin()).abs() / amplitude;
                assert!(error <= limit, "{velocity}, w dt = {w_dt}: {error:e} at step {i}");
                assert_eq!(state.time, i as f64 * step, "the time of a step is i dt to the bit");
            }
        }
    }
}

#[test]
fn amplitudes_grow_linearly_at_the_limit_and_geometrically_beyond() {
    let w = 1024.0;
    let at = |w_dt: f64| {
        scheme(w_dt / w, VelocityAt::LaggedHalfStep, Boundaries::StepEnd).free_states(&spring(w), 1001).unwrap()
    };
    for (i, state) in at(2.0).iter().enumerate() {
        let expected = SPEED * 2.0 / w * i as f64;
        assert!((state.depth.abs() - expected).abs() <= 1e-12 * expected, "step {i}: {}", state.depth);
    }
    let w_dt: f64 = 2.02;
    let half_trace = 1.0 - 0.5 * w_dt * w_dt;
    let growth = -half_trace + (half_trace * half_trace - 1.0).sqrt();
    let states = at(w_dt);
    let measured = (states[1000].depth / states[999].depth).abs();
    assert!((measured / growth - 1.0).abs() < 1e-10, "measured {measured}, theory {growth}");
    assert!(at(1.99).iter().all(|state| state.depth.abs() < SPEED / w * 11.0));
}

#[test]
fn the_stability_limit_separates_decay_from_growth() {
    // A linear spring and dashpot: the limit is sharp, combined too. Ratios g/w on both sides of the value (0.44)
    // below which the predicted rule is limited by the spring.
    for velocity in VelocityAt::ALL {
        for ratio in [0.02, 0.2, 0.43, 0.45, 1.0, 5.0] {
            let w = 100.0;
            let law = stage(0.0, MASS * w * w, MASS * w * ratio, 0.0, INF);
            let problem = endless(&[law]);
            let limit = stability_limit(&law, MASS, SPEED, velocity);
            let last = |part: f64| {
                let scheme = scheme(part * limit, velocity, Boundaries::StepEnd);
                scheme.free_states(&problem, 20_001).unwrap()[20_000].depth.abs()
            };
            let start = SPEED / w;
            assert!(last(0.995) < 1e-3 * start, "{velocity}, g/w = {ratio}: {}", last(0.995));
            let beyond = last(1.005);
            assert!(beyond.is_nan() || beyond > 1e3 * start, "{velocity}, g/w = {ratio}: {beyond}");
        }
    }
    let tunnel = Stage::tunnel(STRENGTH, DRAG);
    let lagged = stability_limit(&tunnel, MASS, SPEED, VelocityAt::LaggedHalfStep);
    approx::assert_relative_eq!(lagged, MASS / (DRAG * SPEED), max_relative = 1e-15);
    for velocity in VelocityAt::ALL {
        assert_eq!(stability_limit(&Stage::tunnel(STRENGTH, 0.0), MASS, SPEED, velocity), INF);
        approx::assert_relative_eq!(stability_limit(&Stage::crater(8.0, 1.0), 2.0, SPEED, velocity), 1.0);
    }
}

#[test]
fn a_constant_force_gives_the_exact_parabola_from_its_first_node_at_equal_and_unequal_steps() {
    let uneven: Vec<f64> = spread(37).map(|u| (0.1 + u) * 1e-5).collect();
    let tunnel = endless(&[Stage::tunnel(STRENGTH, 0.0)]);
    for problem in [tunnel, concrete(0.0, 1.0, SPEED, INF)] {
        let rest = exact_end(&problem);
        for steps in [Steps::Uniform(7.3e-6), Steps::Given(vec![5e-6, 1e-6, 2e-6]), Steps::Given(uneven.clone())] {
            for (velocity, boundaries) in combinations() {
                let scheme = CentralDifference { steps: steps.clone(), ..scheme(1.0, velocity, boundaries) };
                let flight = scheme.solve(&problem, Detail::Trajectory).unwrap();
                // The first node with the tunnel's force, and none of the events.
                let in_tunnel = |row: &&Sample| row.stage + 1 == problem.stages.len() && row.state.velocity > 0.0;
                let first = flight.trajectory.iter().find(in_tunnel).unwrap().state;
                for row in flight.trajectory.iter().filter(in_tunnel) {
                    let t = row.state.time - first.time;
                    let depth = first.depth + t * (first.velocity - 0.5 * t * STRENGTH / MASS);
                    let error = (row.state.depth - depth).abs() / rest.depth;
                    assert!(error < 2e-13, "{velocity} {boundaries} {:?}", row.state);
                }
                if boundaries != Boundaries::StepEnd && problem.stages.len() == 1 {
                    approx::assert_relative_eq!(flight.end.time, rest.time, max_relative = 1e-13);
                    approx::assert_relative_eq!(flight.end.depth, rest.depth, max_relative = 1e-13);
                }
            }
        }
    }
}

#[test]
fn rest_in_the_crater_misses_by_the_constants_of_the_discrete_solution() {
    // X(dt)/X - 1 -> (w dt)²/8, T(dt)/T - 1 -> -(w dt)²/24.
    let problem = concrete(DRAG, 1.0, 100.0, INF);
    let exact = exact_end(&problem);
    let w = (problem.stages[0].stiffness / MASS).sqrt();
    for u in spread(20) {
        // Located inside a step, the time has a further term of order (w dt)³.
        let step = (0.000_5 + 0.002_5 * u) / w;
        let square = (w * step).powi(2);
        for (velocity, boundaries) in combinations() {
            let flight = scheme(step, velocity, boundaries).solve(&problem, Detail::End).unwrap();
            assert_eq!(flight.outcome, Outcome::StoppedInCrater);
            let depth = (flight.end.depth / exact.depth - 1.0) / square;
            let time = (flight.end.time / exact.time - 1.0) / square;
            if boundaries == Boundaries::StepEnd {
                assert!((-1e-3..0.125 + 1e-3).contains(&depth), "{depth}");
            } else {
                assert!((depth * 8.0 - 1.0).abs() < 1e-3, "{velocity} {boundaries} {}", depth * 8.0);
                assert!((time * -24.0 - 1.0).abs() < 1e-3, "{velocity} {boundaries} {}", time * -24.0);
            }
        }
    }
}

#[test]
fn a_given_sequence_of_equal_steps_is_the_uniform_scheme() {
    let problem = concrete(DRAG, 0.6, SPEED, 0.13);
    for (velocity, boundaries) in combinations() {
        let uniform = scheme(3.3e-6, velocity, boundaries).solve(&problem, Detail::Events).unwrap();
        let given = CentralDifference { steps: Steps::Given(vec![3.3e-6; 3]), ..scheme(1.0, velocity, boundaries) };
        let given = given.solve(&problem, Detail::Events).unwrap();
        assert_eq!(uniform.end.depth, given.end.depth);
        assert_eq!(uniform.end.velocity, given.end.velocity);
        assert_eq!(uniform.cost, given.cost);
        approx::assert_relative_eq!(uniform.end.time, given.end.time, max_relative = 1e-15);
    }
}

#[test]
fn a_landing_is_equation_6_with_the_force_of_its_own_side_in_each_half_step() {
    let problem = concrete(DRAG, 0.6, SPEED, INF);
    let step = 3.7e-6;
    let flight = scheme(step, VelocityAt::Centred, Boundaries::Landed).solve(&problem, Detail::Trajectory).unwrap();
    let rows = &flight.trajectory;
    let landed = rows.iter().position(|row| row.state.depth == CRATER_DEPTH).unwrap();
    // Rows: ..., node before, event at k d (crater's force), node at k d (tunnel's force), node behind.
    let (before, event, node, behind) = (rows[landed - 1], rows[landed], rows[landed + 1], rows[landed + 2]);
    assert_eq!((event.stage, node.stage), (0, 1));
    assert_eq!(event.state, node.state);
    let short = node.state.time - before.state.time;
    assert!(short > 0.0 && short < step, "{short}");
    approx::assert_relative_eq!(behind.state.time - node.state.time, step, max_relative = 1e-9);
    let into = (node.state.depth - before.state.depth) / short;
    let out = (behind.state.depth - node.state.depth) / step;
    let kick = 0.5 * (short * event.force + step * node.force) / MASS;
    approx::assert_relative_eq!(out, into - kick, max_relative = 1e-9);
    // And the place: x is met by the step as it was shortened, not put there afterwards.
    let lands = before.state.depth + short * (before.state.velocity - 0.5 * short * before.force / MASS);
    approx::assert_relative_eq!(lands, CRATER_DEPTH, max_relative = 1e-15);
}

#[test]
fn work_is_counted_exactly() {
    let ends = [0.02, 0.05, 0.050_000_1, 0.08];
    let mut list: Stages = ends.iter().map(|end| stage(STRENGTH, 0.0, 0.0, DRAG, *end)).collect();
    list.push(Stage::tunnel(STRENGTH, DRAG));
    for problem in [stages(list.clone(), SPEED, INF), stages(list, SPEED, 0.09)] {
        for (velocity, boundaries) in combinations() {
            for step in [1e-7, 3.3e-6, 1e-4] {
                let scheme = scheme(step, velocity, boundaries);
                let flight = scheme.solve(&problem, Detail::Trajectory).unwrap();
                let each = if velocity == VelocityAt::PredictedHalfStep { 2 } else { 1 };
                let stage_ends =
                    flight.events.iter().filter(|event| matches!(event.kind, EventKind::StageEnd(_))).count();
                let landings = if boundaries == Boundaries::Landed { stage_ends as u64 } else { 0 };
                let cost = flight.cost;
                let expected = 1 + landings + each * (cost.steps + cost.rejected_steps);
                assert_eq!(cost.force_evaluations, expected, "{velocity} {boundaries} {step}");
                assert_eq!(flight.trajectory.len() as u64, cost.steps + flight.events.len() as u64);
                // The detail asked for changes what is listed, not the solution.
                let brief = scheme.solve(&problem, Detail::End).unwrap();
                assert_eq!((brief.end, brief.cost), (flight.end, flight.cost));
                assert_eq!(brief.exit_margin, flight.exit_margin);
                assert!(brief.trajectory.is_empty() && brief.events.len() <= 2);
            }
        }
    }
    let flight = scheme(1e-6, VelocityAt::Centred, Boundaries::StepEnd)
        .solve(&stages(smallvec![Stage::tunnel(1e5, 0.0)], 1.0, INF), Detail::End)
        .unwrap();
    assert_eq!((flight.cost.steps, flight.cost.force_evaluations), (20, 21));
}

/// Places that are located are among those of every method.
#[test]
fn stage_ends_within_one_step_are_listed_in_order_at_its_end() {
    let ends = [0.010, 0.011, 0.012, 0.012, 0.012, 0.013, 0.014, 0.015, 0.016, 0.017];
    let mut list: Stages = ends.iter().map(|end| stage(1e4, 0.0, 0.0, 0.1, *end)).collect();
    list.push(Stage::tunnel(STRENGTH, DRAG));
    for velocity in VelocityAt::ALL {
        let scheme = scheme(3e-5, velocity, Boundaries::StepEnd);
        let flight = scheme.solve(&stages(list.clone(), SPEED, 0.05), Detail::Events).unwrap();
        let expected: Vec<EventKind> = (0..10).map(EventKind::StageEnd).chain([EventKind::Exit]).collect();
        assert_eq!(kinds(&flight.events), expected, "{velocity}");
        let first = flight.events[0].state;
        assert!(first.depth >= 0.017 && flight.events[..10].iter().all(|event| event.state == first), "{velocity}");
        assert!(flight.end.time > first.time && flight.end.depth >= 0.05, "{velocity}");
    }
}

/// M = 2, P = 64, V0 = 8: rest at x = 1, t = 1/4, and every node is exact for steps of 1/64.
fn binary(list: Stages, exit_depth: f64) -> Problem {
    Problem { crater: Some(0), target: Target::CraterAndTunnel, ..stages(list, 8.0, exit_depth) }
}

#[test]
fn crater_end_exit_and_rest_at_one_node_come_in_this_order_and_perforate() {
    let list: Stages = smallvec![stage(64.0, 0.0, 0.0, 0.0, 1.0), Stage::tunnel(64.0, 0.0)];
    for (velocity, boundaries) in combinations() {
        let scheme = scheme(1.0 / 64.0, velocity, boundaries);
        let flight = scheme.solve(&binary(list.clone(), 1.0), Detail::Events).unwrap();
        assert_eq!(kinds(&flight.events), [EventKind::CraterEnd, EventKind::Exit, EventKind::Rest]);
        assert_eq!(flight.outcome, Outcome::Perforated);
        assert_eq!(flight.end, State { time: 0.25, depth: 1.0, velocity: 0.0 });
        assert_eq!((flight.stage, flight.exit_margin), (0, Some(0.0)));
        // A little more target, and it stops on the crater's end, which still is the crater; the tunnel is not asked.
        let beyond = [(64.0, 1.0 + f64::EPSILON), (1.0, INF), (64.0, INF), (1e6, INF)];
        for (tunnel, exit_depth) in beyond.into_iter().take(if boundaries == Boundaries::Landed { 4 } else { 1 }) {
            let list = smallvec![list[0], Stage::tunnel(tunnel, 0.0)];
            let flight = scheme.solve(&binary(list, exit_depth), Detail::Events).unwrap();
            assert_eq!(kinds(&flight.events), [EventKind::CraterEnd, EventKind::Rest]);
            assert_eq!((flight.outcome, flight.stage), (Outcome::StoppedInCrater, 0));
            assert!(flight.exit_margin.is_none_or(|margin| margin < 0.0));
        }
        // A little less, and it leaves.
        let flight = scheme.solve(&binary(list.clone(), 1.0 - f64::EPSILON), Detail::Events).unwrap();
        assert_eq!(kinds(&flight.events)[0], EventKind::Exit, "the crater's end lies behind the target");
        assert_eq!(flight.outcome, Outcome::Perforated);
    }
    // With a step that does not meet the place, located: still all three, at the same place.
    for (velocity, boundaries) in located() {
        let flight =
            scheme(3.0 / 64.0, velocity, boundaries).solve(&binary(list.clone(), 1.0), Detail::Events).unwrap();
        assert_eq!(kinds(&flight.events), [EventKind::CraterEnd, EventKind::Exit, EventKind::Rest]);
    }
}

#[test]
fn the_force_of_the_far_side_holds_from_the_node_that_stands_on_the_end() {
    let step = 1.0 / 64.0;
    for (velocity, boundaries) in combinations() {
        let scheme = scheme(step, velocity, boundaries);
        let jump = smallvec![stage(64.0, 0.0, 0.0, 0.0, 0.75), Stage::tunnel(128.0, 0.0)];
        let flight = scheme.solve(&binary(jump, INF), Detail::Trajectory).unwrap();
        let node = flight.trajectory.iter().rfind(|row| row.state.depth == 0.75).unwrap();
        assert_eq!((node.state.time, node.stage, node.force), (0.125, 1, 128.0));
    }
}

#[test]
fn a_stage_end_touched_on_the_way_back_to_rest_is_reached() {
    // Whole steps see x(6) = 0.984 and V < 0; the vertex in between stands at 1.
    let list: Stages = smallvec![stage(64.0, 0.0, 0.0, 0.0, 0.999), Stage::tunnel(64.0, 0.0)];
    for (velocity, boundaries) in located() {
        let scheme = scheme(3.0 / 64.0, velocity, boundaries);
        let flight = scheme.solve(&binary(list.clone(), INF), Detail::Events).unwrap();
        assert_eq!(kinds(&flight.events), [EventKind::CraterEnd, EventKind::Rest]);
        assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
        approx::assert_relative_eq!(flight.end.depth, 1.0, max_relative = 1e-15);
        assert_eq!(flight.cost.rejected_steps, u64::from(boundaries == Boundaries::Landed));
        let flight = scheme.solve(&binary(list.clone(), 0.999), Detail::Events).unwrap();
        assert_eq!(flight.outcome, Outcome::Perforated);
    }
}

#[test]
fn rest_never_lies_above_a_place_already_reached() {
    // A coarse step through a viscous stage: the parabola has its vertex at x = 0.11, V on the chord falls to zero
    // later, where the parabola is back at 0.06.
    let viscous = |end| stage(64.0, 0.0, 64.0, 0.0, end);
    let problem = stages(smallvec![viscous(0.1), viscous(INF)], 8.0, INF);
    let flight = scheme(0.05, VelocityAt::LaggedHalfStep, Boundaries::Interpolated).solve(&problem, Detail::Events);
    let flight = flight.unwrap();
    assert_eq!(kinds(&flight.events), [EventKind::StageEnd(0), EventKind::Rest]);
    assert_eq!(flight.end.depth, 0.1);
}

#[test]
fn a_step_far_beyond_rest_still_ends_the_flight() {
    // dt F/M exceeds V by up to 1e9: past rest P + Q V² keeps its sign, and a later test would see V run away.
    let cases = [
        concrete(DRAG, 1.0, SPEED, INF),
        concrete(DRAG, 1.0, SPEED, 0.2),
        endless(&[Stage::tunnel(STRENGTH, DRAG)]),
        stages(smallvec![Stage::tunnel(STRENGTH, DRAG)], SPEED, 1.0),
        stages(smallvec![Stage::tunnel(STRENGTH, 1e3)], SPEED, 1.0),
    ];
    for problem in &cases {
        for (velocity, boundaries) in combinations() {
            for step in [1e-3, 1e-2, 1.0, 1e6] {
                let flight = scheme(step, velocity, boundaries).solve(problem, Detail::Events).unwrap();
                assert!(flight.cost.steps < 10, "{velocity} {boundaries} {step}: {:?}", flight.cost);
                let last = flight.events.last().unwrap();
                assert_eq!(flight.end, last.state);
                assert!(flight.end.velocity >= 0.0 && flight.end.depth >= 0.0);
                assert_eq!(
                    flight.outcome == Outcome::Perforated,
                    flight.events.iter().any(|e| e.kind == EventKind::Exit)
                );
                assert!(flight.events.windows(2).all(|pair| {
                    pair[0].state.time <= pair[1].state.time && pair[0].state.depth <= pair[1].state.depth
                }));
                let crater = problem.stages[0].stiffness > 0.0;
                if crater || velocity == VelocityAt::LaggedHalfStep && step >= 1.0 {
                    assert!(!flight.step_limit.unwrap().stable || boundaries == Boundaries::Landed);
                }
            }
        }
    }
}

#[test]
fn step_end_shows_whole_steps_and_the_largest_depth() {
    let step = 7e-6;
    for velocity in VelocityAt::ALL {
        let scheme = scheme(step, velocity, Boundaries::StepEnd);
        for problem in [concrete(DRAG, 1.0, SPEED, 0.13), concrete(DRAG, 1.0, SPEED, INF)] {
            let flight = scheme.solve(&problem, Detail::Trajectory).unwrap();
            for event in &flight.events {
                let steps = (event.state.time / step).round();
                assert_eq!(event.state.time, steps * step);
            }
            let deepest = flight.trajectory.iter().map(|row| row.state.depth).fold(0.0, f64::max);
            assert_eq!(flight.end.depth, deepest);
            if problem.has_exit() {
                assert!(flight.end.depth > 0.13 && flight.trajectory.iter().rev().nth(1).unwrap().state.depth <= 0.13);
            }
        }
    }
}

#[test]
fn the_step_limit_is_that_of_the_stages_crossed() {
    let problem = concrete(DRAG, 1.0, SPEED, INF);
    let w = (problem.stages[0].stiffness / MASS).sqrt();
    let limit_of = |step: f64, velocity, speed: f64| {
        let problem = Problem { impact_speed: speed, ..problem.clone() };
        scheme(step, velocity, Boundaries::Landed).solve(&problem, Detail::End).unwrap().step_limit.unwrap()
    };
    let limit = limit_of(1e-6, VelocityAt::Centred, SPEED);
    approx::assert_relative_eq!(limit.limit, 2.0 / w, max_relative = 1e-14);
    assert!(limit.stable);
    // Drag in the tunnel counts for the lagged rule, at the speed with which the tunnel begins.
    let drag = 500.0;
    let tunnel = stages(smallvec![Stage::tunnel(STRENGTH, drag)], SPEED, 0.01);
    let lagged =
        |step| scheme(step, VelocityAt::LaggedHalfStep, Boundaries::StepEnd).solve(&tunnel, Detail::End).unwrap();
    approx::assert_relative_eq!(lagged(1e-6).step_limit.unwrap().limit, MASS / (drag * SPEED), max_relative = 1e-14);
    assert!(lagged(1.3e-5).step_limit.unwrap().stable);
    assert!(!lagged(1.4e-5).step_limit.unwrap().stable);
    // Each stage is judged by its own speeds and steps.
    let drag = 100.0;
    let slowed = stages(smallvec![stage(4e5, 0.0, 0.0, 0.0, 0.2), stage(4e5, 1e9, 0.0, drag, INF)], SPEED, INF);
    let scheme = CentralDifference {
        steps: Steps::Given([vec![5e-4], vec![2e-6; 10_000]].concat()),
        ..scheme(1.0, VelocityAt::LaggedHalfStep, Boundaries::Landed)
    };
    let flight = scheme.solve(&slowed, Detail::Events).unwrap();
    let behind = flight.events[0].state.velocity;
    assert!(flight.events[0].state.time > 5e-4 && behind < 0.7 * SPEED);
    let expected = stability_limit(&slowed.stages[1], MASS, behind, VelocityAt::LaggedHalfStep);
    let limit = flight.step_limit.unwrap();
    approx::assert_relative_eq!(limit.limit, expected, max_relative = 1e-14);
    assert!(limit.stable);
    // A landed step that crosses the crater at once is short, and stable.
    assert!(limit_of(1.0, VelocityAt::Centred, 300.0 * SPEED).stable);
}

#[test]
fn the_default_step_is_stable_and_affordable() {
    let thin = |k: f64| continuous(MASS, STRENGTH, DRAG, CRATER_DEPTH * k, SPEED, INF);
    for problem in [
        concrete(DRAG, 1.0, SPEED, INF),
        concrete(0.0, 1.0, 1e-3, INF),
        concrete(DRAG, 0.6, SPEED, 0.13),
        concrete(1e3, 1.0, 1e4, INF),
        thin(1e-2),
        thin(1e-8),
        stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, INF)], SPEED, 1.0),
    ] {
        for velocity in VelocityAt::ALL {
            let scheme = CentralDifference { velocity, ..CentralDifference::default() };
            let step = scheme.time_step(&problem);
            let flight = scheme.solve(&problem, Detail::End).unwrap();
            assert!(flight.step_limit.unwrap().stable, "{step}: {:?}", flight.step_limit);
            assert!((100..20_000_000).contains(&flight.cost.steps), "{step}: {:?}", flight.cost);
            approx::assert_relative_eq!(flight.end.time, flight.cost.steps as f64 * step, max_relative = 1e-15);
        }
    }
    // Thinner still, the stability limit wins over the number of steps.
    let thinnest = thin(1e-14);
    let step = CentralDifference::default().time_step(&thinnest);
    let limit = stability_limit(&thinnest.stages[0], MASS, SPEED, VelocityAt::LaggedHalfStep);
    assert_eq!(step, PART_OF_LIMIT * limit);
    let nothing = stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, INF)], 0.0, 0.0);
    assert_eq!(CentralDifference::default().solve(&nothing, Detail::End).unwrap().outcome, Outcome::Perforated);
}

#[test]
fn a_step_that_no_budget_suffices_for_is_refused_after_the_first_steps() {
    let semi_infinite = concrete(DRAG, 1.0, SPEED, INF);
    for problem in [semi_infinite.clone(), Problem { exit_depth: 0.05, ..semi_infinite.clone() }] {
        // The flight lasts 8e-4 s, or 2e-4 s, and a hundred million such steps a ten-thousandth of it at most.
        for step in [1e-16, 1e-300, f64::from_bits(10)] {
            for velocity in VelocityAt::ALL {
                let error = scheme(step, velocity, Boundaries::StepEnd).solve(&problem, Detail::End).unwrap_err();
                let IntegrationError::StepBudgetSpent { last, .. } = error else { unreachable!("{error}") };
                assert!(last.time < 1.1e6 * step && last.velocity > 0.99 * SPEED, "{last}");
            }
        }
    }
    // No time of the flight is too short where it ends, and none is known where the first stage drives.
    assert!(!cannot_end(&semi_infinite, 8.3e-7));
    // c x at the reach of V0 takes 450 of the 600 N s at most.
    assert!(cannot_end(&semi_infinite, 3.9e-7) && cannot_end(&semi_infinite, 2e-7));
    assert!(!cannot_end(&Problem { exit_depth: 5e-8, ..semi_infinite.clone() }, 2e-13));
    let mut driven = semi_infinite;
    driven.stages[0].static_force = -1e-300;
    assert!(!cannot_end(&driven, 1e-300));
}

#[test]
fn a_spent_budget_and_an_overflow_are_errors_with_the_state_reached() {
    let problem = concrete(DRAG, 1.0, SPEED, INF);
    for detail in [Detail::End, Detail::Trajectory] {
        let scheme = CentralDifference { max_steps: 1000, ..scheme(1e-7, VelocityAt::Centred, Boundaries::Landed) };
        let error = scheme.solve(&problem, detail).unwrap_err();
        let IntegrationError::StepBudgetSpent { max_steps: 1000, last, .. } = error else { unreachable!("{error}") };
        approx::assert_relative_eq!(last.time, 1e-4, max_relative = 1e-14);
    }
    // Exactly enough is enough.
    let steps = scheme(1e-6, VelocityAt::Centred, Boundaries::Landed).solve(&problem, Detail::End).unwrap().cost.steps;
    for (max_steps, enough) in [(steps, true), (steps - 1, false)] {
        let scheme = CentralDifference { max_steps, ..scheme(1e-6, VelocityAt::Centred, Boundaries::Landed) };
        assert_eq!(scheme.solve(&problem, Detail::End).is_ok(), enough);
    }
    let driven = endless(&[stage(-1e300, 1e-300, 0.0, 0.0, INF)]);
    let error = scheme(1e6, VelocityAt::Centred, Boundaries::Landed).solve(&driven, Detail::End).unwrap_err();
    assert!(matches!(error, IntegrationError::NotFinite { what: "depth", .. }), "{error}");
    let rough = stages(smallvec![Stage::tunnel(STRENGTH, 1e300)], 1e10, 1.0);
    for velocity in VelocityAt::ALL {
        match scheme(1e-15, velocity, Boundaries::StepEnd).solve(&rough, Detail::End) {
            Ok(flight) => assert!(flight.end.velocity >= 0.0 && flight.end.depth.is_finite()),
            Err(error) => assert!(matches!(error, IntegrationError::NotFinite { .. }), "{error}"),
        }
    }
}

#[test]
fn options_outside_their_domain_are_refused() {
    let problem = concrete(DRAG, 1.0, SPEED, INF);
    let given = [vec![], vec![1e-6, 0.0], vec![1e-6, f64::NAN]].map(Steps::Given);
    for steps in [0.0, -1e-6, f64::NAN, INF].map(Steps::Uniform).into_iter().chain(given) {
        let scheme = CentralDifference { steps, ..CentralDifference::default() };
        assert!(scheme.solve(&problem, Detail::End).unwrap_err().is_usage());
        assert!(scheme.free_states(&problem, 1).unwrap_err().is_usage());
    }
    let scheme = CentralDifference { max_steps: 0, ..CentralDifference::default() };
    assert!(scheme.solve(&problem, Detail::End).unwrap_err().is_usage());
    // A step that is zero as an f32 is no step in f32.
    let scheme = CentralDifference { steps: Steps::Uniform(1e-60), ..CentralDifference::default() };
    assert!(scheme.solve_in(&problem.cast::<f32>(), Detail::End).unwrap_err().is_usage());
}

#[test]
fn other_number_types_give_the_same_path() {
    let problem = concrete(DRAG, 0.6, SPEED, INF);
    for (velocity, boundaries) in combinations() {
        let scheme = scheme(3e-6, velocity, boundaries);
        let flight = scheme.solve(&problem, Detail::Events).unwrap();
        let close = |other: Flight, tolerance: f64| {
            assert_eq!(kinds(&flight.events), kinds(&other.events));
            approx::assert_relative_eq!(flight.end.depth, other.end.depth, max_relative = tolerance);
        };
        close(scheme.solve_in(&problem.cast::<f32>(), Detail::Events).unwrap().values(), 1e-4);
        close(scheme.solve_in(&problem.cast::<twofloat::TwoFloat>(), Detail::Events).unwrap().values(), 1e-13);
        let mut dual = problem.cast::<num_dual::Dual64>();
        dual.impact_speed.eps = 1.0;
        let dual = scheme.solve_in(&dual, Detail::Events).unwrap();
        if boundaries == Boundaries::Landed {
            // The derivative by V0 of the located depth, against a central quotient. The number of steps does not
            // change within it.
            let at = |speed: f64| {
                let problem = Problem { impact_speed: speed, ..problem.clone() };
                scheme.solve(&problem, Detail::End).unwrap().end.depth
            };
            let quotient = (at(SPEED + 1e-3) - at(SPEED - 1e-3)) / 2e-3;
            approx::assert_relative_eq!(dual.end.depth.eps, quotient, max_relative = 1e-4);
        }
        close(dual.values(), 1e-15);
    }
}

#[test]
fn a_constant_source_is_a_smaller_static_force_and_an_end_in_time_changes_the_law() {
    let law = stage(STRENGTH, 2e5, 30.0, DRAG, INF);
    let driven = Stage { static_force: STRENGTH - 4e5, ..law };
    for velocity in VelocityAt::ALL {
        let scheme = scheme(1e-6, velocity, Boundaries::Landed);
        let plain = scheme.free_states(&endless(&[driven]), 101).unwrap();
        let forced = endless(&[law, law]);
        let pushed = scheme.forced_states(&forced, |_, _| 4e5, &[100.5e-6]).unwrap();
        assert_eq!(pushed.len(), 102);
        for (a, b) in plain.iter().zip(&pushed) {
            assert!((a.depth - b.depth).abs() <= 1e-15, "{a} {b}");
        }
        // 2e5 N for 50.5 µs, then none: the difference of the momenta is the impulse, whatever the steps.
        let [first, second] = [[2e5, 0.0], [0.0, 0.0]].map(|push| {
            let weightless = Stage { drag: 0.0, viscosity: 0.0, stiffness: 0.0, ..law };
            let forced = endless(&[weightless, weightless]);
            scheme.forced_states(&forced, |j, _| push[j], &[50.5e-6, 90e-6]).unwrap().pop().unwrap()
        });
        assert!((first.time - 90e-6).abs() < 1e-18);
        assert!((MASS * (first.velocity - second.velocity) / (2e5 * 50.5e-6) - 1.0).abs() < 1e-12);
    }
    let short = CentralDifference { max_steps: 10, ..scheme(1e-6, VelocityAt::Centred, Boundaries::Landed) };
    let problem = endless(&[law]);
    let spent = short.forced_states(&problem, |_, _| 0.0, &[1e-4]).unwrap_err();
    assert!(matches!(spent, IntegrationError::StepBudgetSpent { max_steps: 10, .. }), "{spent}");
    assert!(short.forced_states(&problem, |_, _| 0.0, &[1e-4, 2e-4]).unwrap_err().is_usage());
    assert!(short.forced_states(&problem, |_, _| 0.0, &[]).unwrap_err().is_usage());
}

#[test]
fn each_scale_of_a_stage_sets_the_default_step_where_it_is_the_shortest() {
    // M = 2, all numbers chosen by hand so that one scale is the shortest, a power of two. In front of a stage
    // that starts deeper lies one without any force.
    let free = |end| stage(0.0, 0.0, 0.0, 0.0, end);
    let cases: [(&[Stage], f64, f64, f64); 7] = [
        // The second of two stages is crossed in (5/4 - 1)/V0.
        (&[free(1.0), free(INF)], 4.0, 1.25, 1.0 / 16.0),
        // sqrt(M/s), as the drive leaves no more than 256 N at either end.
        (&[stage(-256.0, 8192.0, 0.0, 0.0, INF)], 4.0, INF, 1.0 / 64.0),
        // M V0/(p + s x) with 64 N where the spring is compressed most, at x = 4 + V0 sqrt(M/s) = 6.
        (&[free(4.0), stage(16.0, 8.0, 0.0, 0.0, INF)], 4.0, INF, 1.0 / 8.0),
        // The same where it is compressed least, with -32 N at x = 4 and -16 N at x = 6.
        (&[free(4.0), stage(-64.0, 8.0, 0.0, 0.0, INF)], 4.0, INF, 1.0 / 4.0),
        // M/r, and M/(q V0).
        (&[stage(0.0, 0.0, 64.0, 0.0, INF)], 4.0, INF, 1.0 / 32.0),
        (&[stage(0.0, 0.0, 0.0, 16.0, INF)], 4.0, INF, 1.0 / 32.0),
        // Without speed no time is needed to stop: M/r alone.
        (&[stage(4.0, 0.0, 2.0, 1.0, INF)], 0.0, INF, 1.0),
    ];
    for (list, speed, exit_depth, scale) in cases {
        let problem = stages(list.iter().copied().collect(), speed, exit_depth);
        assert_eq!(default_time_step(&problem, VelocityAt::Centred), scale / 1e3, "{list:?}");
    }
    // A film of 2^-20 m or a fast dashpot deserves no more than 1e6 steps in what lies behind it.
    let film = free(2.0_f64.powi(-20));
    let cases: [(&[Stage], f64, f64); 3] = [
        // M V0/p, and M/sqrt(p q), which also is there without speed.
        (&[film, stage(2.0, 0.0, 0.0, 0.0, INF)], 4.0, 4.0),
        (&[film, stage(2.0, 0.0, 0.0, 8.0, INF)], 4.0, 0.5),
        (&[stage(0.0, 0.0, 2.0_f64.powi(24), 0.0, 1.0), stage(4.0, 0.0, 0.0, 1.0, INF)], 0.0, 1.0),
    ];
    for (list, speed, scale) in cases {
        let problem = stages(list.iter().copied().collect(), speed, INF);
        assert_eq!(default_time_step(&problem, VelocityAt::Centred), scale / 1e6, "{list:?}");
    }
}

#[test]
fn the_limit_itself_is_unstable_and_a_stage_without_a_step_has_none() {
    let w = 1024.0;
    let limit_of = |problem: &Problem, step| {
        scheme(step, VelocityAt::Centred, Boundaries::StepEnd).solve(problem, Detail::End).unwrap().step_limit.unwrap()
    };
    let limit = limit_of(&spring(w), 2.0 / w);
    assert_eq!((limit.limit, limit.stable), (2.0 / w, false));
    assert!(limit_of(&spring(w), (2.0 / w).next_down()).stable);
    let layer = stage(0.0, 1e12, 0.0, 0.0, 0.0);
    let faced = endless(&[layer, Stage::tunnel(STRENGTH, 0.0)]);
    assert_eq!(limit_of(&faced, 1e-5).limit, INF);
}

#[test]
fn what_lies_behind_the_exit_has_no_effect() {
    let law = stage(STRENGTH, 1e7, 30.0, DRAG, INF);
    let exit_depth: f64 = 0.01;
    for (velocity, boundaries) in combinations() {
        let scheme = CentralDifference { max_steps: 1000, ..scheme(3.3e-6, velocity, boundaries) };
        let alone = scheme.solve(&stages(smallvec![law], SPEED, exit_depth), Detail::Events).unwrap();
        for end in [exit_depth, exit_depth.next_up(), 0.0101] {
            let list = smallvec![Stage { end, ..law }, Stage::tunnel(1e9, 1e3)];
            let backed = scheme.solve(&stages(list, SPEED, exit_depth), Detail::Events).unwrap();
            assert_eq!((backed.end, backed.stage), (alone.end, 0), "{velocity} {boundaries} {end}");
            assert_eq!((backed.cost, backed.exit_margin), (alone.cost, alone.exit_margin));
        }
    }
}

#[test]
fn an_outer_force_that_grows_with_time_gives_the_exact_discrete_cubic() {
    // M x'' = 6 M k t: the second difference of t³ is 6 t dt² exactly, and V(1/2) = V0 asks for x = V0 dt after
    // the first step, so x(i) = V0 t + k t (t² - dt²).
    let (k, step) = (64.0, 1.0 / 64.0);
    let free = stages(smallvec![stage(0.0, 0.0, 0.0, 0.0, INF)], 8.0, INF);
    for velocity in VelocityAt::ALL {
        let scheme = scheme(step, velocity, Boundaries::Landed);
        let states = scheme.forced_states(&free, |_, t| 6.0 * MASS * k * t, &[0.25]).unwrap();
        assert_eq!(states.len(), 17);
        for (i, state) in states.iter().enumerate() {
            let t = i as f64 * step;
            assert_eq!((state.time, state.depth), (t, 8.0 * t + k * t * (t * t - step * step)), "{velocity}");
        }
        // Sixteen steps are enough for sixteen, fifteen are not.
        for (max_steps, enough) in [(16, true), (15, false)] {
            let scheme = CentralDifference { max_steps, ..scheme.clone() };
            assert_eq!(scheme.forced_states(&free, |_, _| 0.0, &[0.25]).is_ok(), enough);
        }
    }
}

#[test]
fn a_flight_without_an_end_is_refused_where_it_becomes_one() {
    let refused = |scheme: &CentralDifference, problem: &Problem| {
        let error = scheme.solve(problem, Detail::End).unwrap_err();
        let IntegrationError::NeverEnds { last, .. } = error else { unreachable!("{error}") };
        last
    };
    let dashpot = |viscosity| stage(0.0, 0.0, viscosity, 0.0, INF);
    for last in [stage(0.0, 0.0, 1.0, 1.0, INF), stage(-5.0, 0.0, 1.0, 1.0, INF)] {
        let alone = endless(&[last]);
        let behind = endless(&[stage(1e3, 0.0, 0.0, 0.0, 0.1), last]);
        for (velocity, boundaries) in combinations() {
            let short = CentralDifference { max_steps: 10, ..scheme(1e-6, velocity, boundaries) };
            assert_eq!(refused(&short, &alone), State::at_impact(&alone));
            assert!((refused(&scheme(1e-6, velocity, boundaries), &behind).depth - 0.1).abs() < 1e-3);
        }
    }
    // A stop before the endless stage is a stop.
    let barrier = endless(&[stage(1e9, 0.0, 0.0, 0.0, 0.1), dashpot(1.0)]);
    assert_eq!(CentralDifference::default().solve(&barrier, Detail::End).unwrap().outcome, Outcome::Stopped);
    // A driven, overdamped projectile creeps to x = 10, where no force is left.
    let creep = stages(smallvec![stage(-1000.0, 100.0, 1000.0, 0.0, INF)], 1.0, INF);
    // A dashpot alone stops the projectile nowhere: V underflows to zero, which is not rest.
    let underflow = stages(smallvec![dashpot(200.0)], SPEED, 10.0);
    for velocity in VelocityAt::ALL {
        let last = refused(&scheme(1e-3, velocity, Boundaries::Interpolated), &creep);
        approx::assert_relative_eq!(last.depth, 10.0, max_relative = 1e-9);
        refused(&scheme(1e-3, velocity, Boundaries::Landed), &underflow);
    }
    // A dashpot with r dt/M = 2 takes all of V in the first half step, and nothing would hold the projectile there.
    let at_once = stages(smallvec![dashpot(256.0)], 8.0, 10.0);
    let lagged = scheme(1.0 / 64.0, VelocityAt::LaggedHalfStep, Boundaries::StepEnd);
    assert_eq!(refused(&lagged, &at_once), State::at_impact(&at_once));
    // The slowest of all speeds moves nothing in a step of 1 ms: refused after 2^16 of them.
    let slowest = f64::from_bits(1);
    let creep = stages(smallvec![dashpot(0.0)], slowest, 1.0);
    let long =
        CentralDifference { max_steps: 3 << 20, ..scheme(1e-3, VelocityAt::LaggedHalfStep, Boundaries::StepEnd) };
    assert_eq!(refused(&long, &creep), State { time: 65_536.0 * 1e-3, depth: 0.0, velocity: slowest });
    // More steps that do move are no standstill: 3/2 2^20 of them to a place one metre away.
    let slow = Problem { impact_speed: 2.0_f64.powi(20) / 1.5, exit_depth: 1.0, ..creep };
    let flight =
        CentralDifference { steps: Steps::Uniform(2.0_f64.powi(-40)), ..long }.solve(&slow, Detail::End).unwrap();
    assert!(flight.cost.steps.abs_diff(3 << 19) <= 1, "{}", flight.cost.steps);
}

#[test]
fn the_quadratic_of_the_centred_rule_has_a_finite_derivative_where_its_roots_meet() {
    // half q V² + V = u - half p with half = 1/2, p = 4, q = 1/2, u = 1: V = -2 twice. F = p + q V² = 6 there, and
    // by V = 2 (u - half p), the vertex, dF/du = 2 q V dV/du = -4.
    let law = stage(4.0, 0.0, 0.0, 0.5, INF);
    let law = stages(smallvec![law], 1.0, 1.0).cast::<num_dual::Dual64>().stages[0];
    let zero = num_dual::Dual64::from_re(0.0);
    let force = VelocityAt::Centred.deceleration(&law, zero, num_dual::Dual64::from_re(1.0).derivative(), zero + 0.5);
    assert_eq!((force.re, force.eps), (6.0, -4.0));
}

#[test]
fn nodes_in_double_double_are_the_exact_discrete_solution_to_30_digits() {
    // Equations 6 to 8 in 256 bits from the same numbers, V* by its definition; M = 3, so that no coefficient
    // divided by it is a double-double.
    type Big = dashu_float::FBig<dashu_float::round::mode::HalfEven, 2>;
    let big = |value: f64| Big::try_from(value).unwrap().with_precision(256).value();
    let step = 7e-6;
    let law = stage(8e5, 7e6, 400.0, 3.1, INF);
    let problem = Problem { mass: 3.0, ..endless(&[law]) };
    let [m, h, p, s, r, q, v0, two] =
        [3.0, step, law.static_force, law.stiffness, law.viscosity, law.drag, SPEED, 2.0].map(big);
    let half = &h / &two;
    let deceleration = |x: &Big, v: &Big| (&p + &s * x + &r * v + &q * v * v) / &m;
    for velocity in VelocityAt::ALL {
        let evaluated_at = |x: &Big, u: &Big| match velocity {
            VelocityAt::LaggedHalfStep => u.clone(),
            VelocityAt::PredictedHalfStep => u - &half * deceleration(x, u),
            VelocityAt::Centred => {
                // The root of V + dt/2 F(x, V)/M = u.
                let (a, b) = (&half * &q / &m, big(1.0) + &half * &r / &m);
                let c = &half * (&p + &s * x) / &m - u;
                ((&b * &b - &two * &two * &a * c).sqrt() - b) / (&two * a)
            }
        };
        let scheme = scheme(step, velocity, Boundaries::StepEnd);
        let states = scheme.free_states(&problem.cast::<twofloat::TwoFloat>(), 101).unwrap();
        let (mut x, mut v) = (big(0.0), v0.clone());
        let mut d = deceleration(&x, &v);
        let mut u = &v0 + &half * &d;
        for state in &states {
            let off = |number: twofloat::TwoFloat, exact: &Big, scale: &Big| {
                ((big(number.hi()) + big(number.lo()) - exact) / scale).to_f64().value().abs()
            };
            let errors = (off(state.depth, &x, &(&v0 * &h)), off(state.velocity, &v, &v0));
            assert!(errors.0 < 1e-29 && errors.1 < 1e-30, "{velocity}: {errors:?}");
            u -= &h * &d;
            x += &h * &u;
            d = deceleration(&x, &evaluated_at(&x, &u));
            v = &u - &half * &d;
        }
    }
}

#[test]
fn places_located_in_double_double_are_those_of_the_parabola_to_30_digits() {
    // A constant force: X = M V0²/(2 p), T = M V0/p, and V² = V0² - 2 p x/M at the end of a stage before.
    use twofloat::TwoFloat;
    let law = |end| stage(7e5, 0.0, 0.0, 0.0, end);
    let two_stages = endless(&[law(0.05), law(INF)]);
    let problem = Problem { mass: 3.0, ..two_stages }.cast::<TwoFloat>();
    let (mass, speed, force) = (problem.mass, problem.impact_speed, problem.stages[0].static_force);
    let depth = (mass * speed * speed).over(force + force);
    let time = (mass * speed).over(force);
    for (velocity, boundaries) in located() {
        let flight = scheme(7e-6, velocity, boundaries).solve_in(&problem, Detail::Events).unwrap();
        let at_end = flight.events[0].state;
        let squared = speed * speed - ((force + force) * at_end.depth).over(mass);
        let passed = (speed - at_end.velocity) * mass.over(force);
        let off = [
            (flight.end.depth - depth).over(depth),
            (flight.end.time - time).over(time),
            (at_end.velocity * at_end.velocity - squared).over(squared),
            (at_end.time - passed).over(passed),
        ]
        .map(|error| error.value().abs());
        assert!(off.iter().all(|error| *error < 1e-29), "{velocity} {boundaries}: {off:?}");
    }
}

/// The paper's slab; mpmath, 40 digits: Eq. 6-8 with lagged drag and whole steps, written out, each step ahead chosen from the node
/// behind it by the rule, or from the list. Steps, depth, time and velocity of the last whole step; at rest the larger of the last two
/// depths.
#[test]
fn automatic_and_given_steps_are_those_of_eq_6_in_forty_digits() {
    let slab = crate::testing::shipped("paper-slab");
    let given = Steps::Given(vec![1e-5, 2e-5, 5e-6]);
    let perforated = [0.333_391_016_418_287_7, 0.002_534_814_558_979_753, 49.498_537_302_436_56];
    let with_list = [0.301_106_175_667_480_64, 0.002_025, 83.270_448_928_919_13];
    for (speed, steps, has_far_side, taken, [depth, time, velocity]) in [
        (200.0, Steps::Automatic(0.02), true, 17, perforated),
        (150.0, Steps::Automatic(0.02), false, 19, [0.223_294_136_005_130_37, 0.003_309_417_022_843_134_5, 0.0]),
        (200.0, Steps::Automatic(0.3), false, 2, [0.155_217_123_278_397_15, 0.005_945_758_262_080_287, 0.0]),
        (200.0, given, true, 173, with_list),
    ] {
        let scene = crate::physics::Scene { thickness: slab.thickness.filter(|_| has_far_side), ..slab.clone() };
        let problem = scene.resolve(speed).unwrap();
        let flight = CentralDifference { steps, ..CentralDifference::default() }.solve(&problem, Detail::End).unwrap();
        assert_eq!(flight.cost.steps, taken, "{flight:?}");
        for (found, expected) in [(flight.end.depth, depth), (flight.end.time, time), (flight.end.velocity, velocity)] {
            assert!((found - expected).abs() <= 1e-12 * expected, "{found} {expected}");
        }
    }
}

#[test]
fn where_a_stage_has_no_longest_step_the_last_one_is_kept() {
    assert_eq!(automatic_step(&Stage::tunnel(1e6, 0.0), 2.0, 300.0), None);
    assert_eq!(automatic_step(&stage(0.0, 8.0, 0.0, 0.0, INF), 2.0, 300.0), Some(1.0));
    assert_eq!(automatic_step(&stage(0.0, 0.0, 4.0, 1.0, INF), 2.0, 8.0), Some(0.2));
    // A crater and a tunnel without drag behind it: equal steps throughout.
    let problem = concrete(0.0, 1.0, SPEED, 0.2);
    let longest = 2.0 * (MASS / problem.stages[0].stiffness).sqrt();
    let solve = |steps| {
        let scheme = CentralDifference { steps, ..CentralDifference::default() };
        scheme.solve(&problem, Detail::Events).unwrap()
    };
    let [automatic, equal] = [Steps::Automatic(0.01), Steps::Uniform(0.01 * longest)].map(solve);
    assert_eq!(automatic.cost.steps, equal.cost.steps);
    // The two steps differ by an ulp.
    assert!((automatic.end.velocity - equal.end.velocity).abs() < 1e-11 * SPEED, "{automatic:?} {equal:?}");
    // A first stage that has none begins with the default.
    let endless = endless(&[Stage::tunnel(STRENGTH, 0.0)]);
    let scheme = CentralDifference { steps: Steps::Automatic(0.5), ..CentralDifference::default() };
    assert_eq!(scheme.time_step(&endless), default_time_step(&endless, scheme.velocity));
}

/// Steps that grow as the drag falls lie within its limit for S < 1. The shorter of the limits of a spring and a drag is
/// beyond that of both.
#[test]
fn each_automatic_step_is_compared_with_the_limit_at_its_own_speed() {
    let spring = MASS * (DRAG * SPEED / MASS).powi(2);
    for (stiffness, safety, stable) in [(0.0, 0.1, true), (0.0, 0.99, true), (spring, 0.6, true), (spring, 0.9, false)]
    {
        let scheme = CentralDifference { steps: Steps::Automatic(safety), ..CentralDifference::default() };
        let problem = endless(&[stage(STRENGTH, stiffness, 0.0, DRAG, INF)]);
        let flight = scheme.solve(&problem, Detail::Events).unwrap();
        assert_eq!(flight.step_limit.map(|limit| limit.stable), Some(stable), "s = {stiffness}, S = {safety}");
    }
}
