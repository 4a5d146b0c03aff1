//! Contracts of a flight under a force that is a table of velocity, for every method that takes one.

use twofloat::TwoFloat;

use super::ends::holds;
use super::laws::{exact_methods, methods};
use super::*;
use crate::physics::ball::Ball;
use crate::physics::condition::Condition;
use crate::physics::force_table::{Row, SpeedTable};
use crate::physics::{EventKind, Law, Outcome, Problem, Scalar, Stage};
use crate::studies::critical_velocity::critical_velocity;
use crate::testing::{Random, kinds};

/// Velocities (m/s) and forces (kN): it stops below 16 m/s, drives from there to 67.3, and slows above.
const ROWS: [[f64; 2]; 6] =
    [[0.0, 400.0], [20.0, -100.0], [60.0, -50.0], [120.0, 360.0], [200.0, 360.0], [300.0, 1000.0]];

fn law(rows: &[[f64; 2]]) -> Law {
    let rows: Vec<_> = rows.iter().map(|&[at, force]| Row { at, force: 1e3 * force }).collect();
    Law::of_table(SpeedTable::new(&rows).unwrap())
}

/// 2 kg.
fn problem(rows: &[[f64; 2]], speed: f64, exit: f64) -> Problem {
    Problem::of_stages(2.0, speed, [Stage::free()]).with_exit(exit).with_law(0, &law(rows))
}

fn everyone() -> Vec<(MethodName, Method)> {
    let options = MethodOptions::default();
    methods(1e-10)
        .into_iter()
        .chain([(MethodName::ClosedForm, Method::new(MethodName::ClosedForm, &options).unwrap())])
        .collect()
}

fn allowed(name: MethodName) -> f64 {
    match name {
        MethodName::Taylor | MethodName::Energy | MethodName::ClosedForm => 16.0 * f64::EPSILON,
        _ => 300.0 * name.promise_at(1e-10),
    }
}

/// Depth or velocity, and time: `x = M ∫ V dV/F`, `t = M ∫ dV/F` over each piece by quadrature with 40 digits (mpmath).
#[test]
fn every_method_goes_through_the_pieces_as_quadrature_over_the_velocity_does() {
    let inf = f64::INFINITY;
    let known = [
        (15.0, inf, 0.002_348_913_564_466_92, 0.0, 0.000_221_807_097_779_182_5),
        (290.0, 0.1, 0.1, 171.980_846_753_506_46, 0.000_454_259_289_051_593_5),
        (290.0, 0.2, 0.2, 72.944_323_586_518_25, 0.001_397_677_036_959_140_4),
        (17.0, 0.01, 0.01, 33.516_858_436_794_68, 0.000_407_028_716_055_971_46),
        (17.0, 0.2, 0.2, 67.314_004_714_619_57, 0.003_496_073_031_999_497),
    ];
    for (name, method) in everyone() {
        for (speed, exit, depth, velocity, time) in known {
            let flight = method.integrator().solve(&problem(&ROWS, speed, exit), Detail::Events).unwrap();
            // A row is no event.
            let end = if exit == inf { EventKind::Rest } else { EventKind::Exit };
            assert_eq!(kinds(&flight.events), [end], "{name} from {speed}");
            for (value, exact, unit) in [
                (flight.end.depth, depth, depth),
                (flight.end.velocity, velocity, speed),
                (flight.end.time, time, time),
            ] {
                assert!(((value - exact) / unit).abs() <= allowed(name), "{name} from {speed}: {value} and {exact}");
            }
        }
    }
}

/// At 67.3 m/s the force vanishes: it is approached from both sides, and with no far side there is no end.
#[test]
fn what_no_force_stops_is_said_and_so_is_the_end_of_the_table() {
    for (name, method) in everyone() {
        let why =
            |speed, exit| method.integrator().solve(&problem(&ROWS, speed, exit), Detail::End).unwrap_err().to_string();
        for speed in [17.0, 60.0, 290.0] {
            assert!(why(speed, f64::INFINITY).contains("approaches for ever"), "{name}: {}", why(speed, f64::INFINITY));
        }
        let said = why(301.0, 0.2);
        assert!(
            said.contains("table of the force ends at V = 300 m/s") && said.contains("V = 301 m/s at x = 0 m"),
            "{name}: {said}"
        );
        // A drive beyond the last row.
        let driven = problem(&[[0.0, 10.0], [100.0, -10.0]], 60.0, 9.0);
        let said = method.integrator().solve(&driven, Detail::End).unwrap_err().to_string();
        assert!(said.contains("ends at V = 100 m/s") && said.contains("V = 100 m/s at x = "), "{name}: {said}");
    }
}

/// 150 m/s is met at 0.119659 m, by quadrature as above; behind it 1 MN.
#[test]
fn a_table_ends_at_a_speed_and_at_a_depth_like_another_force() {
    let text = "projectile.mass = 2\nimpact.velocity = 290\n[[stage]]\n\
                force = { table = 'law-speed-table.csv', V = 'speed_m_s', force = 'force_kN' }\nend_velocity = 150\n\
                [[stage]]\nstatic_force = '1 MN'\n";
    let mut scene = crate::physics::Scene::from_toml(text, "table").unwrap();
    let rows: Vec<_> = ROWS.iter().map(|&[at, force]| Row { at, force: 1e3 * force }).collect();
    scene.forces[0].1 = crate::physics::Force::SpeedTable(SpeedTable::new(&rows).unwrap());
    for (name, method) in methods(1e-10) {
        let flight = method.integrator().solve(&scene.problem().unwrap(), Detail::Events).unwrap();
        assert_eq!(kinds(&flight.events), [EventKind::StageEnd(0), EventKind::Rest], "{name}");
        let (met, exact) = (flight.events[0].state, [0.119_659_476_805_702_98, 0.000_576_375_104_348_851_6]);
        for (value, exact) in [met.depth, met.time].into_iter().zip(exact) {
            assert!((value / exact - 1.0).abs() <= allowed(name), "{name}: {value} and {exact}");
        }
        assert_eq!(met.velocity, 150.0, "{name}");
    }
    let behind = [Stage::free().until(0.05), Stage::tunnel(1e6, 0.0)];
    let staged = Problem::of_stages(2.0, 290.0, behind).with_law(0, &law(&ROWS));
    for (name, method) in everyone() {
        let flight = method.integrator().solve(&staged, Detail::Events).unwrap();
        assert_eq!(kinds(&flight.events), [EventKind::StageEnd(0), EventKind::Rest], "{name}");
        let at = flight.events[0].state;
        let rest = 0.05 + at.velocity * at.velocity / 1e6;
        assert!((flight.end.depth / rest - 1.0).abs() <= allowed(name), "{name}: {} and {rest}", flight.end);
    }
}

/// Rows and speeds that are decimals and `f64` at once; every sixth projectile begins with the velocity of a row.
#[test]
fn enclosures_of_random_tables_hold_the_flight_in_double_double() {
    let (mut random, mut undecided, mut cases, mut refused) = (Random::new(31), 0, 0, 0);
    let mut whole = |least: f64, most: f64| random.uniform(least, most).round();
    for case in 0..300 {
        let mut rows = vec![[0.0, whole(if case % 3 == 0 { -300.0 } else { 1.0 }, 900.0)]];
        for _ in 0..=(case % 5) {
            let before = rows[rows.len() - 1];
            let force = if case % 7 == 0 { before[1] } else { whole(if case % 2 == 0 { -200.0 } else { 1.0 }, 900.0) };
            rows.push([before[0] + whole(1.0, 120.0), force]);
        }
        let last = rows[rows.len() - 1][0];
        let speed = if case % 6 == 0 { rows[rows.len() / 2][0].max(1.0) } else { last * whole(1.0, 63.0) / 64.0 };
        let exit = if case % 4 == 0 { f64::INFINITY } else { whole(1.0, 400.0) / 1024.0 };
        let problem = problem(&rows, speed, exit);
        let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events);
        let found = Enclosure.enclose(&problem.cast(), Detail::Events);
        let (Ok(exact), Ok(found)) = (&exact, &found) else {
            assert!(exact.is_err() && found.is_err(), "{rows:?} from {speed} to {exit}: {exact:?} {found:?}");
            refused += 1;
            continue;
        };
        cases += 1;
        let scale = [exact.end.time.value(), exact.end.depth.value(), problem.impact_speed];
        assert!(
            holds(&found.end, &exact.end, scale),
            "{rows:?} from {speed} to {exit}: {:?} {:?}",
            found.end,
            exact.end
        );
        if found.outcome == Outcome::Undecided {
            undecided += 1;
            continue;
        }
        assert!(
            exact.outcome == Outcome::Undecided || exact.outcome == found.outcome,
            "{rows:?} from {speed} to {exit}"
        );
        let width = found.end.depth.radius / found.end.depth.value() + found.end.time.radius / found.end.time.value();
        assert!(width < 1e-13, "{rows:?} from {speed} to {exit}: {width:e}");
    }
    println!("{cases} cases, {undecided} undecided, {refused} refused");
    assert!(undecided * 50 <= cases && cases > 200, "{undecided} of {cases} undecided, {refused} refused");
}

/// 61.3 m/s is no `f64`: an end of that velocity is that of the row, and one a spacing beside it is not told apart.
#[test]
fn the_end_of_a_stage_at_the_velocity_of_a_row_is_that_of_the_row() {
    let rows = [[0.0, 400.0], [61.3, 200.0], [300.0, 1000.0]];
    let (problem, speed) = (problem(&rows, 200.0, 0.5), Ball::decimal(61.3));
    let ends_at = |speed: Ball| {
        let mut problem = Problem::of_stages(2.0, 200.0, [Stage::free(), Stage::tunnel(1e6, 0.0)]).cast::<Ball>();
        problem.exit_depth = Ball::from_f64(0.5);
        let rows: Vec<_> = rows.iter().map(|&[at, force]| Row { at, force: 1e3 * force }).collect();
        let law = Law::of_table(SpeedTable::new(&rows).unwrap()).ending(Condition::of_speed(speed, 1));
        Enclosure.enclose(&problem.with_law(0, &law), Detail::Events)
    };
    let flight = ends_at(speed).unwrap();
    assert_eq!(kinds(&flight.events), [EventKind::StageEnd(0), EventKind::Rest]);
    assert_eq!(flight.events[0].state.velocity, speed);
    let free = Enclosure.enclose(&problem.cast(), Detail::Events).unwrap();
    assert_eq!((kinds(&free.events), free.outcome), (vec![EventKind::Rest], Outcome::Stopped));
    // From the velocity of the row, and from one that may lie on either side of it.
    let from = |impact_speed: Ball| {
        Enclosure.enclose(&Problem { impact_speed, ..problem.cast() }, Detail::Events).unwrap().outcome
    };
    assert_eq!([from(speed), from(speed.widened(0.1))], [Outcome::Stopped, Outcome::Undecided]);
    let beside = Ball { mid: Ball::from_f64(61.3).mid, ..speed };
    assert!(ends_at(beside).unwrap_err().to_string().contains("one of its table differ"));
}

/// The force vanishes at 50 m/s: from beside it V falls on its piece, or rises beyond its end.
#[test]
fn nothing_is_proved_of_a_flight_that_a_table_may_slow_or_drive() {
    let problem = problem(&[[0.0, 100.0], [100.0, -100.0], [200.0, 100.0]], 50.0, 0.01).cast::<Ball>();
    let from = |impact_speed: Ball| {
        Enclosure.enclose(&Problem { impact_speed, ..problem.clone() }, Detail::Events).unwrap().outcome
    };
    assert_eq!(from(Ball::between(49.9, 50.1)), Outcome::Undecided);
    assert_eq!([Ball::between(50.1, 50.2), Ball::between(49.8, 49.9)].map(from), [Outcome::Perforated; 2]);
}

/// Random tables whose force resists at rest: the closed form, the series and a library method, and the margins with their bounds.
#[test]
fn closed_form_and_series_agree_on_random_tables_within_their_bounds() {
    let (mut random, mut undecided, mut margins) = (Random::new(29), 0, 0);
    for case in 0..400 {
        let mut rows = vec![[0.0, random.uniform(1.0, 900.0)]];
        for _ in 0..=(case % 6) {
            let before = rows[rows.len() - 1];
            let force = if random.uniform(0.0, 1.0) < 0.2 { before[1] } else { random.uniform(1.0, 900.0) };
            rows.push([before[0] + random.log_uniform(0.1, 300.0), force]);
        }
        let speed = rows[rows.len() - 1][0] * random.uniform(0.05, 1.0);
        let unlimited = problem(&rows, speed, f64::INFINITY);
        let rest = ClosedForm.solve(&unlimited, Detail::End).unwrap().end;
        for (name, method) in everyone() {
            let flight = method.integrator().solve(&unlimited, Detail::End).unwrap();
            let error = (flight.end.depth / rest.depth - 1.0).abs().max((flight.end.time / rest.time - 1.0).abs());
            assert!(error <= 16.0 * allowed(name), "{name} on {rows:?} from {speed}: {error:e}");
            let exit = rest.depth * (1.0 + 1e-3 * random.uniform(-1.0, 1.0));
            let against = problem(&rows, speed, exit);
            let exact = ClosedForm.solve(&against, Detail::End).unwrap();
            let flight = method.integrator().solve(&against, Detail::End).unwrap();
            undecided += u32::from(flight.outcome == Outcome::Undecided);
            let agrees = flight.outcome == Outcome::Undecided || flight.outcome.agrees_with(exact.outcome);
            assert!(agrees, "{name} on {rows:?} from {speed}, {exit}");
            if let (Some(margin), Some(bound)) = (flight.exit_margin, flight.exit_margin_error) {
                let allowed = bound + exact.exit_margin_error.unwrap();
                assert!(
                    (margin - exact.exit_margin.unwrap()).abs() <= allowed,
                    "{name} on {rows:?} from {speed}, {exit}"
                );
                margins += 1;
            }
        }
    }
    assert!(undecided <= 8 && margins == 400 * everyone().len(), "{undecided} undecided, {margins} margins");
}

/// The way of the last row's speed is 0.336 m and more.
#[test]
fn a_critical_velocity_below_the_last_row_is_found_though_no_force_is_known_above() {
    let rows = [[0.0, 100.0], [50.0, 60.0], [300.0, 500.0]];
    let longest = ClosedForm.solve(&problem(&rows, 300.0, f64::INFINITY), Detail::End).unwrap().end.depth;
    for share in [0.2, 0.9, 0.999_999] {
        let resolve = |speed| Ok(problem(&rows, speed, share * longest));
        for method in exact_methods() {
            let found = critical_velocity(resolve, &*method).unwrap();
            let rest = ClosedForm.solve(&problem(&rows, found.velocity, f64::INFINITY), Detail::End).unwrap().end;
            assert!((rest.depth / (share * longest) - 1.0).abs() < 1e-13, "{share}: {}", found.velocity);
        }
    }
    let error = critical_velocity(|speed| Ok(problem(&rows, speed, 1.01 * longest)), &Taylor::default()).unwrap_err();
    assert!(error.to_string().contains("the table of the force ends at V = 300 m/s"), "{error}");
}

/// 36 kN take 100 m/s to 80 over 0.1 m, and the table has rows on the way.
#[test]
fn a_trajectory_has_the_places_where_a_table_goes_on_in_its_next_piece() {
    let rows = [[0.0, 36.0], [80.0, 36.0], [90.0, 36.0], [100.0, 36.0]];
    for (name, method) in methods(1e-10) {
        let flight = method.integrator().solve(&problem(&rows, 100.0, f64::INFINITY), Detail::Trajectory).unwrap();
        for (velocity, depth) in [(90.0, 19.0 / 360.0), (80.0, 0.1)] {
            let row = flight.trajectory.iter().find(|row| row.state.velocity == velocity);
            let error = row.map(|row| (row.state.depth / depth - 1.0).abs());
            assert!(error.is_some_and(|error| error <= allowed(name)), "{name} at {velocity}: {error:?}");
        }
    }
}
