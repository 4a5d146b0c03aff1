use twofloat::TwoFloat;

use super::super::energy::Energy;
use super::*;
use crate::integrators::Cost;
use crate::physics::{Advice, EventKind, Outcome};
use crate::testing::{continuous, kinds, of_stages};

fn solve(problem: &Problem) -> Flight {
    Taylor::default().solve(problem, Detail::Events).unwrap()
}

fn relative(value: f64, exact: f64) -> f64 {
    if value == exact { 0.0 } else { ((value - exact) / exact).abs() }
}

fn one_stage(stage: Stage, impact_speed: f64, exit_depth: f64) -> Problem {
    of_stages(1.0, impact_speed, exit_depth, &[stage])
}

#[test]
fn a_boundary_on_the_end_of_a_step_is_passed_once() {
    let scene = continuous(2.0, 848_230.0, 3.25, 0.1, 900.0, f64::INFINITY);
    let flight = Taylor::default().solve(&scene, Detail::Trajectory).unwrap();
    // Samples: impact, crater end, steps of the tunnel, rest.
    let inside = flight.trajectory.len() - 2;
    assert!(inside > 3, "{:?}", flight.trajectory);
    let depth = flight.trajectory[inside].state.depth;
    for end in [depth.next_down(), depth, depth.next_up()] {
        let mut problem = scene.clone();
        problem.stages.insert(1, Stage { end, ..problem.stages[1] });
        let again = Taylor::default().solve(&problem, Detail::Trajectory).unwrap();
        assert_eq!(kinds(&again.events), [EventKind::CraterEnd, EventKind::StageEnd(1), EventKind::Rest]);
        assert!(relative(again.end.depth, flight.end.depth) < 2e-15);
        assert!(again.trajectory.windows(2).all(|s| s[0].state.time <= s[1].state.time));
    }
}

#[test]
fn no_step_spans_more_than_the_phase_in_which_the_sign_of_v_is_decisive() {
    // Driven from far below its balance, a spring takes nearly half a period to rest; the loosest tolerance takes
    // the longest steps.
    let law = Stage { static_force: -100.0, stiffness: 1.0, viscosity: 0.0, drag: 0.0, end: f64::INFINITY };
    for rtol in [0.1, 1e-3, 0.0] {
        let taylor = Taylor::with_rtol(rtol).unwrap();
        let flight = taylor.solve(&one_stage(law, 0.1, f64::INFINITY), Detail::Trajectory).unwrap();
        let longest = flight.trajectory.windows(2).map(|s| s[1].state.time - s[0].state.time).fold(0.0, f64::max);
        assert!(longest <= PHASE_MAX && flight.cost.steps >= 2, "{longest} at rtol {rtol}");
        assert!(relative(flight.end.time, 0.1_f64.atan2(-100.0)) < rtol.max(1e-14), "{:?}", flight.end);
    }
}

#[test]
fn only_stages_entered_cost_anything() {
    let scene = continuous(2.0, 848_230.0, 3.25, 0.1, 60.0, f64::INFINITY);
    let flight = solve(&scene);
    assert_eq!(flight.outcome, Outcome::StoppedInCrater);
    assert_eq!(flight.cost, Cost { steps: 1, rejected_steps: 0, force_evaluations: 23 });
    let lines = Taylor::default().explain(&scene, &flight);
    assert_eq!(lines, ["stage 0: a spring alone: recurrence of one term, no convolution"]);
}

/// Mass 2, one stage: a problem for the parts of a course that are asked directly.
fn alone(stage: Stage, exit_depth: f64) -> Problem {
    Problem::of_stages(2.0, 300.0, [stage]).with_exit(exit_depth)
}

fn course_at(problem: &Problem, depth: f64, velocity: f64) -> Course<'_> {
    let mut course = Course::new(problem, Detail::End);
    course.state = State { time: 0.0, depth, velocity };
    course
}

fn orders() -> Orders<22, 24> {
    Orders(Steps::new(f64::EPSILON))
}

/// `V' = -V²` from V = 1 is `1/(1 + t)`: coefficients 1, -1, 1, ... of V and of x over its order.
#[test]
fn coefficients_keep_the_digits_of_double_double() {
    let law = Stage::<f64>::tunnel(0.0, 1.0);
    let wide = Stage {
        static_force: TwoFloat::from(law.static_force),
        stiffness: TwoFloat::from(0.0),
        viscosity: TwoFloat::from(0.0),
        drag: TwoFloat::from(law.drag),
        end: TwoFloat::from(1.0),
    };
    let series = Series::<TwoFloat, 40>::new::<false, true, true>(&wide, TwoFloat::from(1.0));
    for k in 0..40 {
        let sign = TwoFloat::from(if k % 2 == 0 { 1.0 } else { -1.0 });
        let way = series.advance[k] * TwoFloat::from((k + 1) as f64);
        for off in [series.velocity[k] - sign, way - sign] {
            assert!(off.value().abs() < 1e-28, "order {k}: {:e}", off.value());
        }
    }
}

/// Every term of the error bound with its own factor, in numbers that can be followed by hand.
#[test]
fn a_step_adds_its_roundings_to_a_bar_that_fades() {
    let problem = alone(Stage::tunnel(1.0, 0.0), f64::INFINITY);
    let mut course = course_at(&problem, 0.0, 300.0);
    course.error_bound = f64::EPSILON;
    let law = Stage { static_force: -1.1, stiffness: 0.7, viscosity: 0.3, drag: 0.9, end: 1.0 };
    let start = State { time: 0.0, depth: 0.0, velocity: 1.5 };
    let end = State { time: 0.4, depth: 0.6, velocity: 1.2 };
    orders().0.widen_bound(&mut course, &law, &start, &end, 30.0, 0.8);
    // Force 1.1 + 0.42 + 2.475; roundings 6 V² + 3 F (0.8 + 1.2), truncation 2 V²; a hundredth of it, for V/V0 = 0.1.
    let added = 0.01 * (6.0 * 2.25 + 3.0 * 3.995 * 2.0 + 2.0 * 2.25);
    let fading = (1.0_f64 + (0.3 * 0.4 + 2.0 * 0.9 * 0.6) / 8.0).powi(8);
    let expected = 1.0 / fading + added;
    assert!(
        (course.error_bound / f64::EPSILON / expected - 1.0).abs() < 1e-14,
        "{} for {expected}",
        course.error_bound / f64::EPSILON
    );
}

/// M = 2, r = 10, s = 8, p = -16: equilibrium 2 m, fast rate 2.5 + sqrt(6.25 - 4) = 4 /s.
#[test]
fn a_creep_begins_at_the_line_of_the_fast_rate_and_only_before_the_equilibrium() {
    let stage = Stage { static_force: -16.0, stiffness: 8.0, viscosity: 10.0, drag: 0.0, end: f64::INFINITY };
    let problem = alone(stage, f64::INFINITY);
    for (depth, velocity, limit, creeps) in [
        (0.5, 6.0, 2.0, true),
        (0.5, 6.0_f64.next_up(), 2.0, false),
        (0.5, 6.0, 2.0_f64.next_down(), false),
        (2.0, 0.0, f64::INFINITY, false),
    ] {
        let refused = course_at(&problem, depth, velocity).refuse_creep(limit);
        assert_eq!(refused.is_err(), creeps, "{depth}, {velocity}, {limit}");
    }
}

/// Orders as tabled, in evaluations a step; a tolerance at the seam takes the higher.
#[test]
fn the_order_follows_from_the_tolerance() {
    let drag = one_stage(Stage::tunnel(1.0, 1.0), 10.0, f64::INFINITY);
    let spring = one_stage(Stage { stiffness: 1.0, ..Stage::tunnel(1.0, 0.0) }, 10.0, f64::INFINITY);
    let orders = |taylor: Taylor| {
        [&drag, &spring].map(|problem| {
            let cost = taylor.solve(problem, Detail::End).unwrap().cost;
            cost.force_evaluations as f64 / cost.steps as f64
        })
    };
    for (rtol, expected) in [
        (1e-3, [7.0, 9.0]),
        (5e-6, [11.0, 17.0]),
        (1e-7, [11.0, 17.0]),
        (5e-10, [15.0, 19.0]),
        (1e-11, [15.0, 19.0]),
        (5e-14, [21.0, 23.0]),
        (0.0, [21.0, 23.0]),
    ] {
        assert_eq!(orders(Taylor::with_rtol(rtol).unwrap()), expected, "{rtol:e}");
    }
    // Other number types have the order of their round-off.
    for taylor in [Taylor::default(), Taylor::with_rtol(1e-3).unwrap()] {
        let wide = taylor.solve_in::<TwoFloat>(&drag.cast(), Detail::End).unwrap().cost;
        let short = taylor.solve_in::<f32>(&drag.cast(), Detail::End).unwrap().cost;
        assert_eq!(
            [wide.force_evaluations, short.force_evaluations],
            [39 * wide.steps, 11 * short.steps],
            "{taylor:?}"
        );
    }
}

#[test]
fn every_kind_of_stage_is_explained() {
    let law = |s, r, q, end| Stage { static_force: 1.0, stiffness: s, viscosity: r, drag: q, end };
    let stages = [
        law(0.0, 0.0, 0.0, 0.1),
        law(1.0, 0.0, 0.0, 0.2),
        law(1.0, 1.0, 0.0, 0.3),
        law(0.0, 1.0, 1.0, 0.4),
        law(1.0, 0.0, 1.0, f64::INFINITY),
    ];
    let problem = Problem::of_stages(1.0, 10.0, stages).with_exit(0.5);
    assert_eq!(
        Taylor::default().explain(&problem, &solve(&problem)),
        [
            "stage 0: constant force: the series ends, one step serves",
            "stage 1: a spring alone: recurrence of one term, no convolution",
            "stage 2: no drag: recurrence of two terms, no convolution",
            "stage 3: no stiffness: V monotone, no search for hidden roots",
            "stage 4: stiffness and drag: earliest root isolated on every step",
        ]
    );
    assert_eq!(Taylor::default().name(), "taylor");
}

/// `(tolerance v[0]/|v[k]|)^(1/k)` in full precision; logarithms off by 1 % of h, a power short by up to 6 %.
#[test]
fn a_span_keeps_the_tolerance_in_each_of_the_last_two_orders() {
    let span = |first, before, last, tolerance| {
        let velocity = [first, 0.0, 0.0, 0.0, 0.0, 0.0, before, last];
        Series { velocity, advance: [0.0; 8] }.span(tolerance)
    };
    for tolerance in [1e-3, 1e-9, 1e-16] {
        for first in [1.0, 1.3, 1.9] {
            for size in [1e-2, 1.0, 7e3_f64] {
                let exact = |order: f64| (tolerance * first / size).powf(1.0 / order);
                let last = span(first, 0.0, -size, tolerance) / exact(7.0);
                let before = span(first, size, 0.0, tolerance) / exact(6.0);
                for ratio in [last, before] {
                    assert!(ratio > 0.93 && ratio < 1.01, "{ratio}: {tolerance:e}, {first}, {size}");
                }
            }
        }
    }
}

#[test]
fn a_unit_has_an_inverse_that_is_a_normal_number() {
    for x in [f64::MIN_POSITIVE, 0.75, 1.0, 1.5, f64::MAX, f64::INFINITY] {
        let unit = power_of_two_below(x);
        assert!(unit <= x && (1.0 / unit).is_normal(), "{unit:e} for {x:e}");
    }
}

#[test]
fn the_last_step_of_the_budget_may_end_a_flight_and_no_other_follows() {
    let problem = alone(Stage::tunnel(1.0, 0.0), f64::INFINITY);
    let mut course = course_at(&problem, 0.0, 3.0);
    course.cost.steps = STEPS_MAX - 1;
    assert!(orders().solve_stage(&mut course).is_ok());
    let mut course = course_at(&problem, 0.0, 3.0);
    course.cost.steps = STEPS_MAX;
    let error = orders().solve_stage(&mut course).unwrap_err();
    assert!(matches!(error, IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, .. }));
    // It has no step to lengthen.
    assert!(error.help().contains("--method adaptive") && !error.help().contains("--dt"), "{}", error.help());
}

/// By the inverse series `t = e (1 - b + 2 b² - c)`, `e = D/V`, whose next term is below 1e-20 here.
#[test]
fn the_time_of_a_place_near_the_start_of_a_stage_has_the_round_off_of_that_time() {
    for (mass, stiffness, drag, v) in [
        (20.8, 0.0045, 1.7225, 0.1134),
        (4.7315, 45.61, 0.05038, 42.74995),
        (1.0, 1e5, 1e-2, 1e3),
        (3e-3, 7.0, 0.4, 2.0),
    ] {
        for (exponent, static_force) in
            (-20..=-8).flat_map(|exponent| [(exponent, 0.0), (exponent, 0.01), (exponent, -0.01)])
        {
            let law = Stage { static_force, stiffness, ..Stage::tunnel(0.0, drag) };
            let depth = v * 10f64.powi(exponent);
            let first = -(static_force + drag * v * v) / mass;
            let second = -(stiffness * v + 2.0 * drag * v * first) / mass;
            let e = depth / v;
            let (b, c) = (0.5 * first * e / v, second * e * e / v / 6.0);
            let exact = e * (1.0 - b + 2.0 * b * b - c);
            let alone = solve(&of_stages(mass, v, depth, &[law])).end.time;
            let two = [law.until(depth), Stage { static_force: 1.0, ..law }];
            let passed = solve(&of_stages(mass, v, 1.0, &two)).events[0].state.time;
            for time in [alone, passed] {
                assert!(relative(time, exact) < 4.0 * f64::EPSILON, "{law:?} {depth:e}: {time:e}, {exact:e}");
            }
        }
    }
}

/// `t = 2 H/(V0 + V)`, `V² = V0² + 2 |p| H/M`, and V0 next to nothing.
#[test]
fn a_constant_drive_takes_a_projectile_from_almost_no_speed_through_the_slab() {
    let law = Stage::tunnel(-3.608_37e-5, 0.0);
    for exponent in [0, -3, -12, -15, -17, -30, -100, -300] {
        let v0 = 10f64.powi(exponent);
        let flight = solve(&of_stages(0.002_144_98, v0, 0.036_811_3, &[law]));
        let v = v0.hypot((2.0 * 3.608_37e-5 * 0.036_811_3 / 0.002_144_98_f64).sqrt());
        assert_eq!(flight.outcome, Outcome::Perforated);
        assert!(relative(flight.end.velocity, v) < 4.0 * f64::EPSILON, "{v0:e}: {:?}", flight.end);
        assert!(
            relative(flight.end.time, 2.0 * 0.036_811_3 / (v0 + v)) < 4.0 * f64::EPSILON,
            "{v0:e}: {:?}",
            flight.end
        );
    }
}

/// Depth over speed, near both ends of the range of numbers, and a depth that is a multiple of a small speed.
#[test]
fn a_gap_of_any_size_is_crossed_at_any_speed() {
    for (speed, depth) in [(1e200, 1e-100), (1e-50, 1e150), (2.0_f64.powi(-60), 1.0)] {
        let flight = solve(&one_stage(Stage::tunnel(0.0, 0.0), speed, depth));
        assert_eq!((flight.end.depth, flight.end.velocity), (depth, speed));
        assert!(relative(flight.end.time, depth / speed) < 1e-15, "{:e}", flight.end.time);
    }
}

#[test]
fn a_force_stops_what_drag_has_left_next_to_no_speed() {
    for decades in [100.0, 170.0, 200.0] {
        let drag = Stage::tunnel(0.0, 1.0).until(decades * std::f64::consts::LN_10);
        for behind in [Stage::tunnel(1e3, 0.0), Stage { stiffness: 1e3, ..Stage::tunnel(1.0, 2.0) }] {
            let flight = solve(&of_stages(1.0, 1.0, drag.end + 1.0, &[drag, behind]));
            assert_eq!((flight.outcome, flight.end.depth), (Outcome::Stopped, drag.end));
            let (margin, bound) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap());
            assert!(margin < -bound && bound < 1e-12 * margin.abs(), "{margin} {bound:e}");
        }
    }
}

/// `V = V0 e^(-q H/M)`, down to 1e-260 of V0, `t = M (e^(q H/M) - 1)/(q V0)`.
#[test]
fn drag_may_take_nearly_all_speed_that_numbers_have() {
    for decades in [100.0, 155.0, 260.0] {
        let length = decades * std::f64::consts::LN_10;
        let end = solve(&one_stage(Stage::tunnel(0.0, 1.0), 1.0, length)).end;
        assert!(relative(end.velocity, (-length).exp()) < 1e-12 && relative(end.time, length.exp()) < 1e-12, "{end}");
    }
}

/// `d + (H - d)`, each rounded, is one spacing short of H.
#[test]
fn an_exit_is_at_its_own_depth_where_the_way_to_it_is_rounded() {
    let (d, exit) = (0.5 * f64::EPSILON, 1.0 + 3.0 * f64::EPSILON);
    assert!(d + (exit - d) < exit);
    let gap = Stage::tunnel(0.0, 0.0);
    let mut problem = one_stage(gap, 1.0, exit);
    problem.stages.insert(0, Stage { end: d, ..gap });
    let flight = solve(&problem);
    assert_eq!(kinds(&flight.events), [EventKind::StageEnd(0), EventKind::Exit]);
    assert_eq!((flight.end.depth, flight.cost.steps), (exit, 2));
}

/// F = 1, M = 1, V0 = 1: W/V0² = 1 - 2 H. Eight roundings of it are allowed, and a few of 1 for the distance to rest.
#[test]
fn the_bar_of_a_deep_stop_is_that_of_the_way_it_lacks() {
    let flight = solve(&one_stage(Stage::tunnel(1.0, 0.0), 1.0, 1000.0));
    assert_eq!(flight.exit_margin, Some(-1999.0));
    let units = flight.exit_margin_error.unwrap() / f64::EPSILON / 1999.0;
    assert!(units > 8.0 && units < 8.02, "{units}");
}

/// Theory section 2, `p, s`: a boundary at which a twentieth of the energy is left, in units that are not the step's.
#[test]
fn a_boundary_that_takes_nearly_all_energy_is_within_reach() {
    let (p, s, v, way) = (6.0, 400.0_f64, 10.0, 0.473);
    let law = Stage { static_force: p, stiffness: s, viscosity: 0.0, drag: 0.0, end: way };
    let series = Series::<f64, 24>::new::<true, false, false>(&law, v);
    let start = State { time: 0.0, depth: 0.0, velocity: v };
    let w = s.sqrt();
    let Step::Limit(found) = search(&law, &series, start, PHASE_MAX / w, &Closing::new(f64::EPSILON)) else {
        panic!("the boundary is missed")
    };
    let (u0, u) = (p / s, way + p / s);
    let velocity = (v * v - way * (2.0 * p + s * way)).sqrt();
    let time = (w * (u * v - u0 * velocity)).atan2(velocity * v + s * u * u0) / w;
    assert!(relative(found.velocity, velocity) < 1e-13 && relative(found.time, time) < 1e-14, "{found:?}");
}

/// The method over depth has no root to isolate in time.
#[test]
fn rest_against_stiffness_and_drag_is_found_to_the_digits_of_double_double() {
    for (p, s, q) in [(7.0, 11.0, 0.5), (0.0, 3.0, 2.0), (-4.0, 30.0, 0.1)] {
        let law = Stage { static_force: p, stiffness: s, viscosity: 0.0, drag: q, end: f64::INFINITY };
        let problem = one_stage(law, 5.0, f64::INFINITY).cast::<TwoFloat>();
        let end = Taylor::default().solve_in(&problem, Detail::End).unwrap().end;
        let other = Energy::new().solve_in(&problem, Detail::End).unwrap().end;
        for (value, exact) in [(end.depth, other.depth), (end.time, other.time)] {
            let off = (value - exact).value().abs() / exact.value();
            assert!(off < 1e-28, "{p}, {s}, {q}: {off:e}");
        }
    }
}
