//! Contracts of a solution, each tested once for every method: the rows are methods, the columns are contracts.
//!
//! A method that refuses a problem (`energy` a viscous stage, `closed-form` a stage without one) is left out of that
//! problem. What only one method promises is tested beside it. The fixed-step scheme has other rules at boundaries.

use num_dual::Dual64;
use twofloat::TwoFloat;

use super::*;
use crate::physics::closed_form::critical_of_stages;
use crate::physics::exit_energy::propagate;
use crate::physics::force_table::{ForceTable, Row};
use crate::physics::{Advice, Event, EventKind, Outcome, Problem, Scalar, Stage, State, Target};
use crate::studies::random_problems::Kind;
use crate::studies::relations::{Units, in_units};
use crate::testing::{Random, continuous, kinds, of_stages, random_concrete, stage, tunnel};

const INF: f64 = f64::INFINITY;

/// The methods: to round-off where they can, and to `rtol` where not.
fn methods(rtol: f64) -> Vec<(MethodName, Method)> {
    let options = |name| MethodOptions { rtol: is_tolerant(name).then_some(rtol), ..MethodOptions::default() };
    let names = MethodName::built().filter(|name| name.accuracy() != Accuracy::Step);
    names.map(|name| (name, Method::new(name, &options(name)).unwrap())).collect()
}

/// Whether the method says where it cannot tell: at a place that is just touched it has no answer.
fn proves(name: MethodName) -> bool {
    name == MethodName::Enclosure
}

/// Whether the method works to a tolerance only.
fn is_tolerant(name: MethodName) -> bool {
    name.accuracy() == Accuracy::Tolerance
}

/// The answer, unless the method refuses the problem.
fn answer(method: &Method, problem: &Problem, detail: Detail) -> Option<Result<Flight, IntegrationError>> {
    match method.integrator().solve(problem, detail) {
        Err(error) if error.is_usage() => None,
        answer => Some(answer),
    }
}

/// Every method's name with its flight, but for those that refuse the problem.
fn flights(problem: &Problem) -> Vec<(MethodName, Flight)> {
    let solve = |(name, method): (MethodName, Method)| Some((name, answer(&method, problem, Detail::Events)?.unwrap()));
    methods(1e-10).into_iter().filter_map(solve).collect()
}

/// The flights by fixed steps, of which the target takes some sixty, boundaries being located within a step.
fn located_by_steps(problem: &Problem) -> impl Iterator<Item = (MethodName, Flight)> {
    let step = problem.exit_depth / problem.impact_speed / 64.3;
    let solve = move |boundaries: Boundaries, velocity| {
        let scheme = CentralDifference::uniform(step, velocity, boundaries);
        (MethodName::CentralDifference, scheme.solve(problem, Detail::Events).unwrap())
    };
    [Boundaries::Interpolated, Boundaries::Landed]
        .into_iter()
        .flat_map(move |boundaries| VelocityAt::ALL.map(|velocity| solve(boundaries, velocity)))
}

fn constant(static_force: f64, end: f64) -> Stage {
    stage(static_force, 0.0, 0.0, 0.0, end)
}

/// Up to five stages with jumps, gaps, springs, thin layers and drives.
fn random_stages(random: &mut Random, viscous: bool) -> Problem {
    let count = 1 + random.below(5);
    let scale = random.log_uniform(1e-3, 1e6);
    let mut end = 0.0;
    let mut stages = Vec::new();
    for index in 0..count {
        end += random.log_uniform(1e-3, 1.0);
        let size = scale * random.log_uniform(0.03, 3.0);
        let mut share = || scale * random.log_uniform(0.1, 3.0);
        let (also, drag) = (share(), share());
        let (p, s, q) = match random.below(20) {
            0..7 => (size, 0.0, 0.0),
            7..9 => (-size, 0.0, 0.0),
            9..11 => (0.0, 0.0, size),
            11..13 => (0.0, size, 0.0),
            13..18 => (size, also, drag),
            18 => (-size, size * also / scale, 0.0),
            _ => (0.0, 0.0, 0.0),
        };
        let r = if viscous && random.chance(0.7) { scale * random.log_uniform(0.01, 30.0) } else { 0.0 };
        stages.push(stage(p, s, r, q, if index + 1 == count { INF } else { end }));
    }
    of_stages(scale, random.log_uniform(0.3, 3.0), end * random.uniform(0.7, 1.0), &stages)
}

/// Problems of tables whose force rises and falls, drives and resists, with a far side.
fn random_tables(random: &mut Random, count: usize) -> Vec<Problem> {
    std::iter::repeat_with(|| Kind::Table.draw(random)).flatten().take(count).collect()
}

/// The pieces of the table of these rows, and the last stage behind it.
fn table(rows: &[[f64; 2]], behind: Stage) -> Vec<Stage> {
    let rows: Vec<_> = rows.iter().map(|&[at, force]| Row { at, force }).collect();
    ForceTable::new(&rows).unwrap().stages(0.0).chain([behind]).collect()
}

/// A force that falls through zero at 1.5 m, to a drive, and through it again at 2.5 m.
const BARRIER: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 8.0], [2.0, -8.0], [3.0, 8.0]];

/// References: closed form at 50 digits from these f64 inputs.
#[test]
fn the_tunnel_scene_has_the_depth_and_times_of_fifty_digits() {
    for (name, method) in methods(1e-12) {
        let limit = match name {
            MethodName::Tsit45 | MethodName::Adaptive => 1e-10,
            name if is_tolerant(name) => 1e-8,
            _ => 1e-14,
        };
        let flight = method.integrator().solve(&tunnel(INF), Detail::Events).unwrap();
        assert_eq!((flight.outcome, flight.exit_margin), (Outcome::StoppedInTunnel, None), "{name}");
        assert_eq!(kinds(&flight.events), [EventKind::CraterEnd, EventKind::Rest], "{name}");
        let crater = flight.crater_end().unwrap();
        assert_eq!(crater.depth, 0.1, "{name}");
        for (found, exact) in [
            (flight.end.depth, 0.144_826_200_112_217_07),
            (flight.end.time, 8.291_966_948_249_334e-4),
            (crater.time, 3.749_918_414_549_262e-4),
            (crater.velocity, 202.320_580_497_900_37),
        ] {
            assert!((found / exact - 1.0).abs() < limit, "{name}: {found:e} for {exact:e}");
        }
    }
}

/// A time is conditioned like V0/V at a boundary; a velocity by its square, in units of V0.
#[test]
fn random_flights_end_where_when_and_as_fast_as_the_closed_form_says() {
    let mut random = Random::new(1);
    let problems: Vec<_> = (0..400).map(|_| random_concrete(&mut random)).collect();
    for (name, method) in methods(1e-12) {
        let ([depth_limit, time_limit, energy_limit], count) = match name {
            MethodName::Tsit45 | MethodName::Adaptive => ([1e-11, 1e-10, 1e-10], 40),
            name if is_tolerant(name) => ([1e-9, 1e-8, 1e-8], 20),
            _ => ([5e-15, 1e-13, 2e-14], problems.len()),
        };
        let mut compared = 0;
        for problem in problems.iter().take(count) {
            let exact = ClosedForm.solve(problem, Detail::Events).unwrap();
            let flight = method.integrator().solve(problem, Detail::Events).unwrap();
            let speeds = || exact.events.iter().map(|e| e.state.velocity / problem.impact_speed);
            let slowest = speeds().filter(|v| *v > 0.0).fold(1.0, f64::min);
            if [flight.outcome, exact.outcome].contains(&Outcome::Undecided) || slowest < 0.1 {
                continue;
            }
            compared += 1;
            assert_eq!((flight.outcome, flight.stage), (exact.outcome, exact.stage), "{name}: {problem:?}");
            assert_eq!(kinds(&flight.events), kinds(&exact.events), "{name}: {problem:?}");
            for (event, exact) in flight.events.iter().zip(&exact.events) {
                let (found, exact) = (event.state, exact.state);
                let energy = |v: f64| (v / problem.impact_speed).powi(2);
                assert!((found.depth / exact.depth - 1.0).abs() < depth_limit, "{name}: {found} {exact}");
                assert!((found.time / exact.time - 1.0).abs() * slowest < time_limit, "{name}: {found} {exact}");
                assert!((energy(found.velocity) - energy(exact.velocity)).abs() < energy_limit, "{name}: {found}");
            }
        }
        assert!(4 * compared > count, "{name}: {compared} of {count}");
    }
}

/// One stage of each family, resisting and driving, to rest and through an exit: the closed form has 50 digits to be
/// compared with, and is compared with them in its own tests.
#[test]
fn a_stage_of_each_family_ends_where_when_and_as_fast_as_its_closed_form_says() {
    for (law, speed, exit_depth, limit) in [
        (stage(7.0, 0.0, 3.0, 0.0, INF), 5.0, INF, 2e-15),
        (stage(7.0, 11.0, 0.0, 0.0, INF), 5.0, INF, 1e-15),
        (stage(-7.0, 11.0, 0.0, 0.0, INF), 5.0, INF, 1e-15),
        (stage(-1e4, 2.0, 0.0, 0.0, INF), 0.5, INF, 1e-14),
        (stage(-0.1, 1e4, 0.0, 0.0, INF), 1e3, INF, 1e-14),
        // Underdamped and driven: it swings through the balance at 10 m, on to rest.
        (stage(-1000.0, 100.0, 15.0, 0.0, INF), 0.1, INF, 1e-14),
        (stage(0.0, 0.0, 2.0, 0.0, INF), 10.0, 4.0, 1e-14),
        (stage(0.0, 0.0, 0.0, 2.0, INF), 10.0, 4.0, 1e-14),
        (stage(-40.0, 0.0, 0.0, 0.5, INF), 20.0, 0.25, 1e-14),
        (stage(0.0, 0.0, 0.0, 0.0, INF), 10.0, 4.0, f64::MIN_POSITIVE),
    ] {
        let problem = of_stages(1.0, speed, exit_depth, &[law]);
        let exact = ClosedForm.solve(&problem, Detail::End).unwrap();
        for (name, flight) in flights(&problem) {
            assert_eq!(flight.outcome, exact.outcome, "{name}, {law:?}");
            let limit = if is_tolerant(name) { 1e-6 } else { limit };
            let scale = if is_tolerant(name) || flight.outcome.is_stop() { speed } else { exact.end.velocity };
            let errors = [
                flight.end.depth / exact.end.depth - 1.0,
                flight.end.time / exact.end.time - 1.0,
                (flight.end.velocity - exact.end.velocity) / scale,
            ];
            assert!(errors.iter().all(|error| error.abs() < limit), "{name}, {law:?}: {errors:?}");
        }
    }
}

/// V1² = 0 at V0 = sqrt(k d P/M), approached from both sides down to one spacing.
#[test]
fn rest_near_the_crater_end_is_continuous_and_cheap() {
    let law = tunnel(INF);
    let touching = (law.stages[0].end * law.stages[1].static_force / law.mass).sqrt();
    for (name, method) in methods(1e-10).into_iter().filter(|(name, _)| !is_tolerant(*name)) {
        for (power, sign) in (1..=17).flat_map(|power| [1.0, -1.0].map(|sign| (power, sign))) {
            let speed = touching * (1.0 + sign * 10.0_f64.powi(-power));
            let problem = Problem::continuous(law.mass, speed, law.stages[0].end, law.stages[1]);
            let exact = ClosedForm.solve(&problem, Detail::End).unwrap().end;
            let flight = method.integrator().solve(&problem, Detail::End).unwrap();
            let off = [flight.end.depth / exact.depth - 1.0, flight.end.time / exact.time - 1.0];
            assert!(off[0].abs() < 5e-15 && off[1].abs() < 1e-14, "{name}, 1e-{power}: {off:?}");
            assert!(flight.cost.steps <= 4 || name != MethodName::Taylor, "{name}: {:?}", flight.cost);
            assert!(power >= 14 || (flight.outcome == Outcome::StoppedInTunnel) == (sign > 0.0), "{name}, 1e-{power}");
        }
    }
}

#[test]
fn a_tolerance_is_kept_at_less_work_the_looser_it_is_and_refused_outside_its_range() {
    let mut random = Random::new(5);
    let mut problems: Vec<_> = (0..200).map(|_| random_concrete(&mut random).with_exit(INF)).collect();
    problems.push(continuous(2.0, 848_230.0, 3.25, 0.1, 900.0, 0.4));
    for name in MethodName::built().filter(|name| name.accuracy() == Accuracy::RoundOff) {
        let with = |rtol| Method::new(name, &MethodOptions { rtol, ..MethodOptions::default() });
        for bad in [0.0, -1e-6, 0.2, 0.5, f64::NAN] {
            assert!(with(Some(bad)).is_err_and(|error| error.is_usage()), "{name}: {bad}");
        }
        let mut work = Vec::new();
        for rtol in [Some(1e-3), Some(1e-6), Some(1e-9), Some(1e-12), None] {
            let method = with(rtol).unwrap();
            let mut evaluations = 0;
            for problem in &problems {
                let exact = ClosedForm.solve(problem, Detail::End).unwrap().end;
                let flight = method.integrator().solve(problem, Detail::End).unwrap();
                let off = [flight.end.depth / exact.depth - 1.0, flight.end.time / exact.time - 1.0];
                let rtol = rtol.unwrap_or(0.0);
                assert!(off[0].abs() < rtol.max(5e-15) && off[1].abs() < rtol.max(1e-13), "{name}, {rtol:e}: {off:?}");
                let slower = (flight.end.velocity - exact.velocity).abs() / problem.impact_speed;
                assert!(slower < rtol.max(1e-14), "{name}, {rtol:e}: {slower:e}");
                evaluations += flight.cost.force_evaluations;
            }
            work.push(evaluations);
        }
        assert!(work.windows(2).all(|w| w[0] < w[1]), "{name}: {work:?}");
    }
}

/// Powers of two as units of length, mass and time: no number rounds differently, and no step is taken more.
#[test]
fn units_are_free_to_the_bit() {
    let mut random = Random::new(8);
    for _ in 0..200 {
        let problem = random_stages(&mut random, true);
        for (name, method) in methods(1e-10).into_iter().filter(|(name, _)| !is_tolerant(*name)) {
            let Some(Ok(flight)) = answer(&method, &problem, Detail::Events) else { continue };
            for (length, mass, time) in
                [(67, 60, 67), (-67, -60, -67), (-100, -100, -100), (30, 40, -40), (-40, -30, 20)]
            {
                let [length, mass, time] = [length, mass, time].map(|power| 2_f64.powi(power));
                let scaled = in_units(&problem, Units { length, mass, time });
                let other = method.integrator().solve(&scaled, Detail::Events).unwrap();
                let State { time: t, depth, velocity } = flight.end;
                let end = State { time: t * time, depth: depth * length, velocity: velocity / time * length };
                assert_eq!((other.end, other.cost), (end, flight.cost), "{name}: {length} m, {time} s, {problem:?}");
                assert_eq!(other.exit_margin_error, flight.exit_margin_error, "{name}");
            }
        }
    }
}

/// Exact margins: `energy` in double-double from the same coefficients; behind viscosity the series at round-off.
#[test]
fn the_error_bound_of_the_margin_holds_and_is_not_idle() {
    let mut random = Random::new(7);
    let exact = |problem: &Problem| Energy::new().exit_margin_in(&problem.cast::<TwoFloat>()).unwrap().unwrap().0;
    let mut scenes: Vec<(Problem, TwoFloat)> = Vec::new();
    for index in 0..120 {
        let problem = if index < 60 { random_concrete(&mut random) } else { random_stages(&mut random, false) };
        let margin = exact(&problem);
        scenes.push((problem, margin));
    }
    for problem in random_tables(&mut random, 40) {
        let margin = exact(&problem);
        scenes.push((problem, margin));
    }
    let dry = scenes.len();
    for _ in 0..60 {
        let problem = random_stages(&mut random, true);
        if let Ok(flight) = Taylor::default().solve(&problem, Detail::End) {
            scenes.push((problem, flight.exit_margin.unwrap().into()));
        }
    }
    assert!(scenes.len() > dry + 50);
    for rtol in [1e-4, 1e-7, 1e-9] {
        for (name, method) in methods(rtol) {
            let mut worst = 0.0_f64;
            let scenes = if is_tolerant(name) { &scenes } else { &scenes[..dry] };
            let reused = method.integrator().reusing();
            let integrator = reused.as_deref().unwrap_or(method.integrator());
            for (problem, exact) in scenes {
                let flight = match integrator.solve(problem, Detail::End) {
                    Err(error) if error.is_usage() => continue,
                    flight => flight.unwrap_or_else(|error| panic!("{name}: {error} {problem:?}")),
                };
                let (margin, bound) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap());
                let error = (*exact - TwoFloat::from(margin)).hi().abs();
                assert!(error <= bound, "{name}: {error:e} of {bound:e} in {problem:?}");
                worst = worst.max(error / bound);
                let decided = flight.outcome != Outcome::Undecided;
                assert_eq!(decided, margin.abs() > bound, "{name}: {problem:?}");
                let perforated = flight.outcome == Outcome::Perforated;
                assert!(!decided || perforated == (exact.hi() > 0.0), "{name}: {problem:?}");
            }
            println!("{name} {rtol:e}: at worst {worst:.3} of the error bound");
            assert!(worst < 0.6 && worst > 0.004, "{name} at {rtol:e}: {worst} of the error bound");
        }
    }
}

/// Of 35,000 random problems the one in which `tsit45` errs most at its default tolerance: 7.4 rtol.
#[test]
fn the_error_bound_holds_where_a_method_errs_most_of_thousands() {
    let stage = stage(0.662_756_862_111_514_5, 0.308_364_126_951_587_4, 0.0, 0.004_701_105_307_622_592, INF);
    let problem = of_stages(0.030_043_731_325_005_096, 15.126_894_839_268_273, 1.064_401_785_257_801_6, &[stage]);
    let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::End).unwrap().exit_margin.unwrap();
    for (name, method) in methods(1e-10) {
        let flight = match method.integrator().solve(&problem, Detail::End) {
            Err(error) if error.is_usage() => continue,
            flight => flight.unwrap(),
        };
        let (error, bound) = ((flight.exit_margin.unwrap() - exact).abs(), flight.exit_margin_error.unwrap());
        assert!(error <= bound + 4.0 * f64::EPSILON, "{name}: {error:e} of {bound:e}");
    }
}

/// At V0 = `V_c` (1 ± 10^-j) the outcome is right or undecided, and undecided only within the error bound.
#[test]
fn near_the_critical_velocity_the_outcome_is_right_or_undecided() {
    let mut random = Random::new(3);
    let mut problems = vec![
        tunnel(0.14),
        tunnel(0.05),
        continuous(0.9, 245_000.0, 0.0, 0.0538, 390.0, 0.2),
        // A barrier, then a drive: the least W is that behind the barrier.
        of_stages(1.0, 4.0, 3.0, &[constant(8.0, 1.0), constant(-100.0, INF)]),
        // What is left of a slab behind a jump of the force is a millionth of the depth before it.
        of_stages(2.0, 1.0, 0.1 + 1e-6, &[stage(0.0, 1.0, 0.0, 0.0, 0.1), constant(84_823.0, INF)]),
        // What just gets over a barrier of a table creeps towards the place where the force falls through zero.
        of_stages(1.0, 4.0, 2.5, &table(&BARRIER, constant(1.0, INF))),
        of_stages(1.0, 4.0, 1.5, &table(&BARRIER, constant(1.0, INF))),
        // Touching: a force that falls to zero and rises again.
        of_stages(1.0, 4.0, 1.0, &table(&[[0.0, 8.0], [1.0, 0.0], [2.0, 8.0]], constant(1.0, INF))),
    ];
    problems.extend((0..5).map(|_| random_concrete(&mut random)));
    for problem in &problems {
        let critical = critical_of_stages(problem).unwrap().velocity;
        for (name, method) in methods(1e-8) {
            let mut undecided = 0;
            for power in 1..=17 {
                for sign in [1.0, -1.0] {
                    let impact_speed = critical * (1.0 + sign * 10_f64.powi(-power));
                    let problem = Problem { impact_speed, ..problem.clone() };
                    let flight = method.integrator().solve(&problem, Detail::End).unwrap();
                    let (margin, bound) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap());
                    assert_eq!(flight.outcome == Outcome::Undecided, margin.abs() <= bound, "{name}, 1e-{power}");
                    match flight.outcome {
                        Outcome::Undecided => undecided += 1,
                        // Two spacings: the critical velocity is rounded.
                        Outcome::Perforated => assert!(sign > 0.0 || power > 15, "{name}, 1e-{power}: {problem:?}"),
                        _ => assert!(sign < 0.0 || power > 15, "{name}, 1e-{power}: {problem:?}"),
                    }
                }
            }
            let most = if is_tolerant(name) { 28 } else { 16 };
            assert!(undecided <= most, "{name}: {undecided} undecided of {problem:?}");
            assert!(undecided > 0 || proves(name), "{name} decides what its bound cannot tell, of {problem:?}");
        }
    }
}

/// `V_c² = 1000/4 + 1/4`: behind a spring, 1 kg/s take 1 m/s for each metre of half a metre.
#[test]
fn an_approach_that_the_error_bound_cannot_tell_from_arrival_is_undecided() {
    let stages = [stage(0.0, 1e3, 0.0, 0.0, 0.5), stage(0.0, 0.0, 1.0, 0.0, INF)];
    for (name, method) in methods(1e-8) {
        let mut undecided = 0;
        for power in 4..=17 {
            for sign in [1.0, -1.0] {
                let speed = 250.25_f64.sqrt() * (1.0 + sign * 10_f64.powi(-power));
                match answer(&method, &of_stages(1.0, speed, 1.0, &stages), Detail::End) {
                    None => undecided = 4,
                    Some(Ok(Flight { outcome: Outcome::Undecided, .. })) => undecided += 1,
                    Some(Ok(flight)) => assert!(flight.outcome == Outcome::Perforated && sign > 0.0, "{name}"),
                    Some(Err(error)) => {
                        let never_ends = matches!(error, IntegrationError::NeverEnds { .. });
                        assert!(never_ends && sign < 0.0, "{name}, 1e-{power}: {error}");
                    }
                }
            }
        }
        assert!(undecided >= 2, "{name}: {undecided}");
    }
}

/// The method over time or over depth, in numbers of any type.
fn solve_in<S: Scalar>(name: MethodName, problem: &Problem<S>, detail: Detail) -> Result<Flight<S>, IntegrationError> {
    match name {
        MethodName::Taylor => Taylor::default().solve_in(problem, detail),
        _ => Energy::new().solve_in(problem, detail),
    }
}

/// Depth and time of the tunnel scene in twenty digits, and the derivatives of the closed form (docs/theory.md, section
/// 2) by V0, in the tunnel alone and behind a crater of given c: nothing is of `f64` only.
#[test]
fn digits_and_derivatives_are_those_of_the_type_of_numbers() {
    let of = TwoFloat::from;
    // Two exact pieces each.
    let digits = |head: f64, tail: f64, scale: f64| (TwoFloat::new_mul(head, 1e6) + of(tail)).over(of(scale));
    let depth = digits(14_482_620_011_221.0, 707_453.0, 1e20);
    let time = digits(82_919_669_482_493.0, 341_157.0, 1e22).over(of(10.0));
    // c is computed in double-double too, since the digits were.
    let mut wide = tunnel(INF).cast::<TwoFloat>();
    let (mass, kd, law) = (wide.mass, wide.stages[0].end, wide.stages[1]);
    wide.stages[0].stiffness = (mass * (law.static_force + law.drag * of(9e4))).over(kd * (mass + kd * law.drag));
    for name in [MethodName::Taylor, MethodName::Energy] {
        let single = solve_in::<f32>(name, &tunnel(INF).cast(), Detail::Events).unwrap();
        assert_eq!(single.outcome, Outcome::StoppedInTunnel, "{name}");
        assert!((single.end.depth.value() / depth.value() - 1.0).abs() < 5e-7, "{name}: {:?}", single.end);
        let end = solve_in(name, &wide, Detail::End).unwrap().end;
        for (found, exact) in [(end.depth, depth), (end.time, time)] {
            let off = (found.over(exact) - of(1.0)).value().abs();
            assert!(off < 5e-20, "{name}: {off:e}");
        }
        let (m, v0, law) = (2.0, 300.0, Stage::tunnel(848_230.0, 3.25));
        for (c, kd) in [(0.0, 0.0), (9e6, 0.1)] {
            let crater = (kd > 0.0).then(|| Stage::crater(c, kd));
            let mut problem = Problem::crater_and_tunnel(m, v0, crater, law).cast::<Dual64>();
            problem.impact_speed = problem.impact_speed.derivative();
            let v1 = f64::sqrt(v0 * v0 - c * kd * kd / m);
            let (force, left) = (law.static_force + law.drag * v1 * v1, (-2.0 * law.drag * 0.04 / m).exp());
            let rest = solve_in(name, &problem, Detail::Events).unwrap().end;
            problem.exit_depth = Dual64::from_re(kd + 0.04);
            let exit = solve_in(name, &problem, Detail::Events).unwrap().end;
            for (slope, exact) in [
                (rest.depth.eps, m * v0 / force),
                (rest.time.eps, m * v0 / v1 / force - kd / v0 / v1),
                (exit.velocity.eps, v0 / exit.velocity.re * left),
            ] {
                assert!((slope / exact - 1.0).abs() < 1e-14, "{name}, {kd}: {slope:e} {exact:e}");
            }
            assert_eq!(exit.depth.eps, 0.0, "{name}");
        }
    }
}

/// Double-double takes other steps, and what two methods have in common is neither a variable nor a line: all that
/// they find of stages of any kind is the same, so it does not depend on how it was computed.
#[test]
fn stages_of_any_kind_give_the_numbers_of_double_double_by_the_other_method() {
    let mut random = Random::new(2);
    let mut compared = [0; 3];
    let mut tables = random_tables(&mut random, 90).into_iter();
    for case in 0..990 {
        let problem = if case < 900 { random_stages(&mut random, case % 3 == 0) } else { tables.next().unwrap() };
        let problem = if case % 2 == 0 { problem } else { problem.with_exit(INF) };
        let viscous = problem.stages.iter().any(|law| law.viscosity > 0.0);
        let other = |name| if viscous || name == MethodName::Energy { MethodName::Taylor } else { MethodName::Energy };
        for name in if viscous { &[MethodName::Taylor][..] } else { &[MethodName::Taylor, MethodName::Energy] } {
            let flight = solve_in(*name, &problem, Detail::Trajectory);
            let exact = solve_in::<TwoFloat>(other(*name), &problem.cast(), Detail::Events);
            let (flight, exact) = match (flight, exact) {
                (Ok(flight), Ok(exact)) => (flight, exact.values()),
                (Err(a), Err(b)) => {
                    assert_eq!(std::mem::discriminant(&a), std::mem::discriminant(&b), "{name}: {problem:?}");
                    continue;
                }
                (a, b) => panic!("{name}: {problem:?}\n{a:?}\n{b:?}"),
            };
            compared[usize::from(*name == MethodName::Energy) + 2 * usize::from(viscous)] += 1;
            assert_eq!((flight.outcome, kinds(&flight.events)), (exact.outcome, kinds(&exact.events)), "{problem:?}");
            for rows in flight.trajectory.windows(2).map(|rows| [rows[0].state, rows[1].state]) {
                let ascends = rows[0].time <= rows[1].time && rows[0].depth <= rows[1].depth;
                assert!(ascends, "{name}: {rows:?} in {problem:?}");
            }
            assert!(flight.cost.steps < 400, "{name}: {:?}", flight.cost);
            // A boundary passed slowly, before or here, scatters the time after it.
            let fastest = exact.events.iter().map(|e| e.state.velocity).fold(problem.impact_speed, f64::max);
            let passed = exact.events.iter().filter(|e| e.kind != EventKind::Rest);
            let condition = passed.map(|e| fastest / e.state.velocity).fold(1.0, f64::max);
            for (found, exact) in flight.events.iter().zip(&exact.events).map(|(a, b)| (a.state, b.state)) {
                let off = [(found.depth, exact.depth), (found.time, exact.time)]
                    .map(|(a, b)| if a == b { 0.0 } else { (a / b - 1.0).abs() });
                let off = [off[0], off[1], (found.velocity - exact.velocity).abs() / fastest];
                let within = off.iter().zip([5e-15, 2e-14, 2e-14]).all(|(off, limit)| *off < limit * condition);
                assert!(within, "{name}: {off:?} over {condition:e}, {found} for {exact} in {problem:?}");
            }
        }
    }
    assert!(compared.iter().all(|count| *count > 150), "{compared:?}");
}

#[test]
fn events_at_one_place_are_listed_in_order() {
    let (end, crater, exit) = (EventKind::StageEnd, EventKind::CraterEnd, EventKind::Exit);
    let no_length = [constant(1.0, 0.0), constant(1.0, 0.5), constant(9.0, 0.5), constant(1.0, INF)];
    let many: Vec<_> = [0.01, 0.02, 0.02, 0.02, 0.03, 0.03_f64.next_up(), 0.05, 0.1, 0.1, 0.1_f64.next_up(), 0.14]
        .map(|end| constant(1.0, end))
        .into_iter()
        .chain([constant(1.0, INF)])
        .collect();
    for (problem, expected, stage) in [
        (tunnel(0.1), vec![crater, exit], 0),
        (tunnel(0.1_f64.next_up()), vec![crater, exit], 1),
        (tunnel(0.05), vec![exit], 0),
        (tunnel(1e-9), vec![exit], 0),
        (of_stages(1.0, 2.0, 1.0, &no_length), vec![end(0), end(1), end(2), exit], 3),
        // Stages without length behind the one that ends at the exit are listed before it.
        (of_stages(1.0, 2.0, 0.5, &no_length), vec![end(0), end(1), end(2), exit], 1),
        (of_stages(1.0, 2.0, 0.14, &many), (0..11).map(end).chain([exit]).collect(), 10),
        (Problem { crater: Some(1), ..of_stages(1.0, 2.0, 0.5, &no_length) }, vec![end(0), crater, end(2), exit], 1),
    ] {
        for (name, flight) in flights(&problem).into_iter().chain(located_by_steps(&problem)) {
            assert_eq!((kinds(&flight.events), flight.stage), (expected.clone(), stage), "{name}");
            assert_eq!((flight.outcome, flight.end.depth), (Outcome::Perforated, problem.exit_depth), "{name}");
            for (before, after) in flight.events.windows(2).map(|e| (e[0].state, e[1].state)) {
                let is_later = before.time < after.time || after.depth - before.depth < 1e-9;
                assert!(before.time <= after.time && is_later, "{name}: {before} {after}");
            }
            let is_off = |e: &Event| matches!(e.kind, EventKind::StageEnd(i) if e.state.depth != problem.stages[i].end);
            assert!(!flight.events.iter().any(is_off), "{name}: {:?}", flight.events);
            assert_eq!(flight.events.last().unwrap().state, flight.end, "{name}");
        }
    }
}

/// Powers of two: 8 N stop 1 kg at 4 m/s after 1 m and 0.5 s. A tolerance is all that some methods have.
#[test]
fn a_place_that_is_touched_is_reached() {
    let wall = |end| constant(8.0, end);
    // Behind a gap that takes 1/8 s.
    let at_exit = of_stages(1.0, 4.0, 1.5, &[constant(0.0, 0.5), wall(1.5), wall(1.5), wall(INF)]);
    // A drive behind the place does not start what has come to rest; any more speed would get through.
    let before_a_drive = of_stages(1.0, 4.0, 2.0, &[wall(1.0), constant(-100.0, INF)]);
    let mut at_crater_end = of_stages(1.0, 4.0, INF, &[wall(1.0), wall(INF)]);
    (at_crater_end.crater, at_crater_end.target) = (Some(0), Target::CraterAndTunnel);
    for (name, flight) in flights(&at_exit) {
        assert_eq!((flight.outcome, flight.stage), (Outcome::Undecided, 1), "{name}");
        if !(is_tolerant(name) || proves(name)) {
            let all = [0, 1, 2].map(EventKind::StageEnd).into_iter().chain([EventKind::Exit, EventKind::Rest]);
            assert_eq!((kinds(&flight.events), flight.exit_margin), (all.collect(), Some(0.0)), "{name}");
            assert_eq!(flight.end, State { time: 0.625, depth: 1.5, velocity: 0.0 }, "{name}");
        }
    }
    for (name, flight) in flights(&before_a_drive) {
        assert_eq!(flight.outcome, Outcome::Undecided, "{name}");
        let is_told = !(is_tolerant(name) || proves(name));
        assert!(!is_told || (flight.exit_margin, flight.end.depth) == (Some(0.0), 1.0), "{name}");
    }
    for (name, flight) in flights(&at_crater_end).into_iter().filter(|(name, _)| !is_tolerant(*name)) {
        if proves(name) {
            assert_eq!((flight.outcome, kinds(&flight.events)), (Outcome::Undecided, Vec::new()));
            assert!((flight.end.depth - 1.0).abs() < 1e-15 && (flight.end.time - 0.5).abs() < 1e-7, "{}", flight.end);
            continue;
        }
        assert_eq!((flight.outcome, flight.stage), (Outcome::StoppedInCrater, 0), "{name}");
        assert_eq!(kinds(&flight.events), [EventKind::CraterEnd, EventKind::Rest], "{name}");
        assert_eq!(flight.end, State { time: 0.5, depth: 1.0, velocity: 0.0 }, "{name}");
    }
}

/// Which methods are compared with is the closed form, and that with 50 digits in its own tests.
#[test]
fn tables_of_either_slope_are_flown_through_as_the_closed_form_says() {
    let mut random = Random::new(4);
    let problems = random_tables(&mut random, 60);
    for (name, method) in methods(1e-10) {
        let limit = match name {
            MethodName::Tsit45 | MethodName::Adaptive => 1e-8,
            name if is_tolerant(name) => 2e-7,
            _ => 1e-13,
        };
        let mut compared = 0;
        for problem in &problems[..if is_tolerant(name) { 12 } else { 60 }] {
            let exact = ClosedForm.solve(problem, Detail::Events).unwrap();
            let flight = method.integrator().solve(problem, Detail::Events).unwrap();
            assert_eq!((flight.outcome, flight.stage), (exact.outcome, exact.stage), "{name}: {problem:?}");
            assert_eq!(kinds(&flight.events), kinds(&exact.events), "{name}: {problem:?}");
            let fastest = exact.events.iter().map(|e| e.state.velocity).fold(problem.impact_speed, f64::max);
            let passed = exact.events.iter().filter(|e| e.kind != EventKind::Rest);
            let condition = passed.map(|e| fastest / e.state.velocity).fold(1.0, f64::max).powi(2);
            if condition > 1e4 {
                continue;
            }
            compared += 1;
            for (event, exact) in flight.events.iter().zip(&exact.events) {
                let (found, exact) = (event.state, exact.state);
                let off = [
                    found.depth / exact.depth - 1.0,
                    found.time / exact.time - 1.0,
                    (found.velocity - exact.velocity) / fastest,
                ];
                let within = off.iter().all(|off| off.abs() < limit * condition);
                assert!(within, "{name}: {off:?} over {condition}, {found} for {exact}");
            }
        }
        assert!(compared > 8, "{name}: {compared}");
    }
}

/// By hand: 4 J up to 1 m and 2 J up to 1.5 m take 12 (m/s)² of 1 kg, and the drive gives 4 of them back up to 2 m.
#[test]
fn a_barrier_of_a_table_decides_and_the_drive_behind_it_does_not() {
    let barrier = |speed: f64, exit: f64| of_stages(1.0, speed, exit, &table(&BARRIER, constant(1.0, INF)));
    for (name, flight) in flights(&barrier(4.0, 2.0)) {
        let limit = if is_tolerant(name) { 1e-7 } else { 1e-14 };
        assert_eq!(flight.outcome, Outcome::Perforated, "{name}");
        // The least speed, not that at the exit, is what perforating needs.
        assert!((flight.exit_margin.unwrap() - 4.0 / 16.0).abs() < limit, "{name}: {:?}", flight.exit_margin);
        assert!((flight.end.velocity - 8.0_f64.sqrt()).abs() < 4.0 * limit, "{name}: {}", flight.end);
    }
    // 1 (m/s)² is missing: from 3 of them at 1 m, rest where 16 u - 16 u² = 3 for u = x - 1.
    for (name, flight) in flights(&barrier(11.0_f64.sqrt(), 2.0)) {
        let limit = if is_tolerant(name) { 1e-6 } else { 1e-14 };
        assert_eq!(flight.outcome, Outcome::Stopped, "{name}");
        assert!((flight.exit_margin.unwrap() + 1.0 / 11.0).abs() < limit, "{name}: {:?}", flight.exit_margin);
        assert!((flight.end.depth - 1.25).abs() < limit, "{name}: {}", flight.end);
    }
    // All that is left is spent at the place where nothing stops it: whether it gets there nobody can say.
    for (name, flight) in flights(&barrier(12.0_f64.sqrt(), 2.0)) {
        if proves(name) {
            // The root is rounded, and what the rounding leaves is said.
            assert!(flight.outcome == Outcome::Stopped && flight.end.depth < 1.5, "{flight:?}");
            continue;
        }
        assert_eq!(flight.outcome, Outcome::Undecided, "{name}: {flight:?}");
        assert!(flight.end.time.is_finite() && flight.end.time > 1.0 / 3.0_f64.sqrt(), "{name}: {}", flight.end);
    }
}

#[test]
fn a_table_ends_the_flight_at_its_last_row_unless_rest_comes_first() {
    let (rows, free) = ([[0.0, 4.0], [1.0, 4.0], [2.0, 0.0]], stage(0.0, 0.0, 0.0, 0.0, INF));
    let open =
        |speed: f64| Problem { target: Target::StagesToEndOfTable, ..of_stages(1.0, speed, INF, &table(&rows, free)) };
    let fixed = CentralDifference::uniform(1e-4, VelocityAt::Centred, Boundaries::Landed);
    let mut answers: Vec<_> = methods(1e-9)
        .iter()
        .map(|(name, m)| (*name, [2.0, 4.0].map(|v| answer(m, &open(v), Detail::End).unwrap())))
        .collect();
    let by_steps = [2.0, 4.0].map(|speed| fixed.solve(&open(speed), Detail::End));
    answers.push((MethodName::CentralDifference, by_steps));
    for (name, [rests, moves]) in answers {
        let rests = rests.unwrap();
        assert_eq!((rests.outcome, rests.exit_margin), (Outcome::Stopped, None), "{name}");
        assert!((rests.end.depth - 0.5).abs() < 1e-7, "{name}: {}", rests.end);
        let Err(error @ IntegrationError::TableEnds { last }) = moves else { panic!("{name}: {moves:?}") };
        assert!((last.depth, (last.velocity - 2.0).abs() < 1e-6) == (2.0, true), "{name}: {error}");
        assert!(!error.is_usage() && error.last() == Some(last) && error.help().contains("rows"), "{name}");
    }
}

#[test]
fn stages_that_are_not_reached_cost_nothing_and_are_not_asked() {
    let first = constant(8.0, 2.0);
    for unreached in [stage(f64::NAN, 0.0, 0.0, 0.0, INF), stage(1e308, 1e308, 0.0, 1e308, INF)] {
        for exit_depth in [INF, 2.0] {
            for (name, method) in methods(1e-10) {
                let cost = |stages: &[Stage]| {
                    let problem = of_stages(1.0, if exit_depth < INF { 8.0 } else { 4.0 }, exit_depth, stages);
                    let flight = method.integrator().solve(&problem, Detail::End).unwrap();
                    assert_eq!(flight.stage, 0, "{name}");
                    (flight.cost, flight.end.velocity)
                };
                assert_eq!(cost(&[first, unreached]), cost(&[first, constant(1.0, INF)]), "{name}");
            }
        }
    }
}

#[test]
fn a_flight_without_an_end_is_an_error_with_the_state_reached() {
    let endless = [
        (stage(0.0, 0.0, 0.0, 0.0, INF), INF),
        (stage(0.0, 0.0, 2.0, 0.0, INF), INF),
        (stage(0.0, 0.0, 0.0, 2.0, INF), INF),
        (stage(-1.0, 0.0, 3.0, 1.0, INF), INF),
        (stage(-5.0, 0.0, 0.0, 1.0, INF), INF),
        // r alone covers M V0/r = 5 m and no more; with drag ln(1 + q V0/r)/q.
        (stage(0.0, 0.0, 2.0, 0.0, INF), 5.01),
        (stage(0.0, 0.0, 2.0, 1.0, INF), 1.96),
        // Overdamped towards x = 10.
        (stage(-1000.0, 100.0, 1000.0, 0.0, INF), INF),
        (stage(-1000.0, 100.0, 1000.0, 5.0, INF), 10.5),
    ];
    // Behind a first stage without force: the state reached is in the second.
    for (law, exit_depth) in endless {
        for (name, method) in methods(1e-8) {
            for (problem, entered) in [
                (of_stages(1.0, 10.0, exit_depth, &[law]), 0.0),
                (of_stages(1.0, 10.0, exit_depth, &[stage(0.0, 0.0, 0.0, 0.0, 0.001), law]), 0.001),
            ] {
                let Some(answer) = answer(&method, &problem, Detail::Events) else { continue };
                let error = answer.unwrap_err();
                assert!(matches!(error, IntegrationError::NeverEnds { .. }), "{name} {law:?}: {error}");
                assert!(error.last().unwrap().depth >= entered, "{name}: {error}");
            }
        }
    }
    // Just this side of each limit the flight ends.
    for (law, exit_depth) in [
        (stage(0.0, 0.0, 2.0, 0.0, INF), 4.99),
        (stage(0.0, 0.0, 2.0, 1.0, INF), 1.79),
        (stage(-1.0, 0.0, 3.0, 1.0, INF), 50.0),
    ] {
        for (name, flight) in flights(&of_stages(1.0, 10.0, exit_depth, &[law])) {
            assert_eq!(flight.outcome, Outcome::Perforated, "{name}, {law:?}");
        }
    }
}

/// A coefficient over the mass is beyond the range; then each is within it and their sum is not.
#[test]
fn forces_beyond_the_range_of_numbers_are_errors_and_no_nan() {
    for problem in [
        of_stages(1e-300, 1.0, 1.0, &[constant(1e300, INF)]),
        of_stages(1.0, 1e200, 1.0, &[stage(1e308, 0.0, 0.0, 1e308, INF)]),
    ] {
        for (name, method) in methods(1e-6) {
            let Err(error) = method.integrator().solve(&problem, Detail::Events) else {
                // The closed form of a stop may stay within the range.
                assert_eq!(name, MethodName::ClosedForm);
                continue;
            };
            let known = matches!(error, IntegrationError::NotFinite { .. } | IntegrationError::SolverFailed { .. });
            assert!(known || (proves(name) && error.is_usage()), "{name}: {error}");
        }
    }
}

#[test]
fn a_flight_that_ends_at_impact_takes_no_step() {
    for (name, method) in methods(1e-8) {
        for (problem, outcome, events) in [
            (Problem { impact_speed: 0.0, ..tunnel(0.2) }, Outcome::StoppedInCrater, vec![EventKind::Rest]),
            (tunnel(0.0), Outcome::Perforated, vec![EventKind::Exit]),
        ] {
            let [flight, end] =
                [Detail::Events, Detail::End].map(|detail| method.integrator().solve(&problem, detail).unwrap());
            assert_eq!((flight.outcome, flight.cost), (outcome, Cost::default()), "{name}");
            assert_eq!((kinds(&flight.events), end.events.len()), (events, 0), "{name}");
        }
    }
}

#[test]
fn detail_changes_what_is_listed_and_no_number_and_a_trajectory_keeps_the_energy() {
    for problem in [0.12, INF].map(tunnel) {
        for (name, method) in methods(1e-8) {
            let [end, events, trajectory] = [Detail::End, Detail::Events, Detail::Trajectory]
                .map(|detail| method.integrator().solve(&problem, detail).unwrap());
            for other in [&events, &trajectory] {
                assert_eq!((end.end, end.cost, end.outcome), (other.end, other.cost, other.outcome), "{name}");
                assert_eq!((end.exit_margin, end.exit_margin_error), (other.exit_margin, other.exit_margin_error));
            }
            assert!(end.events.is_empty() && end.trajectory.is_empty() && events.trajectory.is_empty(), "{name}");
            assert_eq!(events.events, trajectory.events, "{name}");
            let rows = &trajectory.trajectory;
            assert_eq!(rows[0].state, State::at_impact(&problem), "{name}");
            assert_eq!(rows.last().unwrap().state, end.end, "{name}");
            for (before, after) in rows.windows(2).map(|rows| (rows[0].state, rows[1].state)) {
                assert!(before.time < after.time && before.depth < after.depth, "{name}: {before} {after}");
                let limit = if is_tolerant(name) { 1e-8 } else { 2e-15 };
                let law = problem.stages.iter().find(|law| after.depth <= law.end).unwrap();
                let w = propagate(law, problem.mass, before.velocity.powi(2), before.depth, after.depth);
                let off = (w - after.velocity.powi(2)).abs() / 9e4;
                assert!(off < limit, "{name}, from {before} to {after}: {off:e}");
            }
            let force = |row: &Sample| problem.stages[row.stage].force(row.state.depth, row.state.velocity);
            assert!(rows.iter().all(|row| row.force == force(row)), "{name}");
        }
    }
}

/// Largest distance of the states of `flight` from `exact`: depth over that of the end, speed over V0.
fn off_path(problem: &Problem, flight: &Flight, exact: &[State]) -> f64 {
    assert_eq!(flight.trajectory.len(), exact.len());
    let off = |(row, exact): (&Sample, &State)| {
        let (found, speed) = (row.state, (row.state.velocity - exact.velocity) / problem.impact_speed);
        assert_eq!(found.time, exact.time);
        ((found.depth - exact.depth) / flight.end.depth).abs().max(speed.abs())
    };
    flight.trajectory.iter().zip(exact).map(off).fold(0.0, f64::max)
}

/// Places on the exact path, the events among them, each with its time: the formulas know the time of a depth, and the
/// method is asked for the state at that time.
fn exact_path(problem: &Problem, places: u32) -> Vec<State> {
    let end = ClosedForm.solve(problem, Detail::Events).unwrap().end;
    let depth = |i: u32| end.depth * f64::from(i) / f64::from(places);
    let inside = (1..places).map(|i| crate::integrators::closed_form::state_at(problem, depth(i)).unwrap().unwrap());
    [State::at_impact(problem)].into_iter().chain(inside).collect()
}

#[test]
fn the_states_at_given_times_are_as_accurate_as_the_end_and_change_no_number() {
    let mut random = Random::new(12);
    let mut problems = vec![tunnel(0.12), tunnel(INF)];
    problems.extend((0..40).map(|_| random_concrete(&mut random)));
    // Of each family of stages: viscous, spring and drive, drag alone, free flight.
    problems.push(of_stages(2.0, 30.0, INF, &[stage(50.0, 0.0, 20.0, 0.0, 1.0), stage(400.0, 30.0, 9.0, 0.0, INF)]));
    problems.push(of_stages(1.0, 5.0, 3.0, &[stage(-20.0, 40.0, 0.0, 0.0, 1.0), stage(-1.0, 0.0, 0.0, 0.5, INF)]));
    problems.push(of_stages(1.0, 5.0, 3.0, &[stage(0.0, 0.0, 0.0, 2.0, 1.0), stage(0.0, 0.0, 0.0, 0.0, INF)]));
    problems.push(of_stages(1.0, 0.5, 3.0, &[stage(-200.0, 0.0, 0.0, 1.0, INF)]));
    problems.push(of_stages(1.0, 4.0, 2.5, &table(&BARRIER, constant(1.0, INF))));
    problems.push(of_stages(1.0, 3.0, INF, &table(&BARRIER, constant(1.0, INF))));
    for (name, method) in methods(1e-9) {
        let limit = match name {
            MethodName::Tsit45 | MethodName::Adaptive => 1e-7,
            name if is_tolerant(name) => 5e-6,
            _ => 1e-13,
        };
        let mut worst = 0.0_f64;
        for problem in &problems {
            let exact = exact_path(problem, 29);
            let mut times: Vec<_> = exact.iter().map(|state| state.time).collect();
            let Some(events) = answer(&method, problem, Detail::Events).map(Result::unwrap) else { continue };
            // An end that is off by more than the last of these times leaves that out.
            if events.end.time < *times.last().unwrap() {
                continue;
            }
            times.extend([events.end.time, events.end.time * 1.01, INF]);
            let mut flight = method.integrator().solve(problem, Detail::Times(&times)).unwrap();
            assert_eq!(flight.trajectory.pop().unwrap().state, events.end, "{name}");
            assert_eq!((flight.trajectory[0].state, flight.trajectory[0].stage), (exact[0], 0), "{name}");
            worst = worst.max(off_path(problem, &flight, &exact));
            assert_eq!(Flight { trajectory: Vec::new(), ..flight }, events, "{name}");
        }
        assert!(worst < limit, "{name}: {worst:e}");
    }
}

/// Viscosity and drag alone: V = v e/(1 + y), x = (M/q) ln(1 + y) with e = e^(-r t/M), y = (q v/r) (1 - e); the far side is
/// where all speed is gone.
#[test]
fn the_way_to_a_place_that_is_only_approached_is_known_at_each_time() {
    let (mass, v, r, q) = (2.0, 3.0, 1.5, 0.5_f64);
    let depth = |gone: f64| mass / q * (q * v / r * gone).ln_1p();
    let problem = of_stages(mass, v, depth(1.0), &[stage(0.0, 0.0, r, q, INF)]);
    let times = [0.5, 2.0, 10.0];
    let mut seen = 0;
    for (name, method) in methods(1e-12) {
        let Some(Ok(flight)) = answer(&method, &problem, Detail::Times(&times)) else { continue };
        seen += 1;
        let exact = times.map(|time| {
            let gone = -(-r / mass * time).exp_m1();
            State { time, depth: depth(gone), velocity: v * (1.0 - gone) / (1.0 + q * v / r * gone) }
        });
        let off = off_path(&problem, &flight, &exact);
        assert!(off < if is_tolerant(name) { 1e-6 } else { 1e-14 }, "{name}: {off:e}");
    }
    assert!(seen > 0);
}

/// The scheme has no dense output: inside a step V runs linearly and x along its parabola, which costs no order.
#[test]
fn the_states_of_the_scheme_at_given_times_are_of_its_order_and_its_nodes_are_among_them() {
    for problem in [tunnel(0.12), tunnel(INF)] {
        let exact = exact_path(&problem, 97);
        let times: Vec<_> = exact.iter().map(|state| state.time).collect();
        let scheme = |steps: f64| CentralDifference::uniform(8e-4 / steps, VelocityAt::Centred, Boundaries::Landed);
        let error = |steps: f64| {
            let flight = scheme(steps).solve(&problem, Detail::Times(&times)).unwrap();
            off_path(&problem, &flight, &exact)
        };
        let noted = scheme(100.3).solve(&problem, Detail::Times(&times)).unwrap().notes;
        assert!(noted.iter().any(|note| note.contains("no solution inside a step")), "{noted:?}");
        let (coarse, fine) = (error(100.3), error(401.2));
        assert!(fine < 1e-4 && (coarse / fine).log2() > 3.5, "{coarse:e} {fine:e}");
        for boundaries in Boundaries::ALL {
            let scheme = CentralDifference::uniform(1.7e-6, VelocityAt::LaggedHalfStep, boundaries);
            let nodes = scheme.solve(&problem, Detail::Trajectory).unwrap().trajectory;
            let mut states: Vec<_> = nodes.iter().map(|row| row.state).collect();
            states.dedup();
            let times: Vec<_> = states.iter().map(|state| state.time).collect();
            let rows = scheme.solve(&problem, Detail::Times(&times)).unwrap().trajectory;
            let steps = rows.iter().zip(&states).filter(|(row, state)| row.state == **state).count();
            // Under `step-end` an event and the step in which it is seen end at one time.
            assert!(
                rows.len() == states.len() && steps + 2 >= states.len(),
                "{boundaries}: {steps} of {}",
                states.len()
            );
        }
    }
}

#[test]
fn a_method_that_reuses_its_solver_has_the_same_name_order_and_answers() {
    let mut random = Random::new(11);
    let problems: Vec<_> = (0..20).map(|_| random_stages(&mut random, true)).collect();
    for (name, method) in methods(1e-7) {
        let integrator = method.integrator();
        let Some(reused) = integrator.reusing() else {
            assert!(!name.needs_diffsol(), "{name}");
            continue;
        };
        assert_eq!((reused.name(), reused.order()), (integrator.name(), integrator.order()));
        for problem in &problems {
            // Making a solver takes two evaluations, which a solver that is reused saves.
            let without_cost = |flight: Flight| Flight { cost: Cost::default(), ..flight };
            let [alone, again] =
                [integrator, &*reused].map(|by| by.solve(problem, Detail::Trajectory).map(without_cost));
            assert_eq!(alone, again, "{name}");
        }
    }
}
