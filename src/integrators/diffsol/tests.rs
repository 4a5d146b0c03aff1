use super::*;
use crate::integrators::Energy;
use crate::physics::{Advice, Outcome, Stage};
use crate::testing::{Random, of_stages, random_concrete, stage, tunnel};

fn kind_and_place(end: StageEnd) -> (&'static str, Node) {
    match end {
        StageEnd::Limit(at) => ("limit", at),
        StageEnd::Condition(at) => ("condition", at),
        StageEnd::Rest(at) => ("rest", at),
        StageEnd::Approach(at, _) => ("approach", at),
    }
}

#[test]
fn boundary_crossed_twice_within_a_step_is_found_at_its_first_crossing() {
    // xi = 2 t - t², u = 2 - 2 t: past 0.75 at t = 0.5, at rest past it at t = 1, back before it at t = 1.5.
    let law = |distance: f64| Stage::tunnel(2.0, 0.0).until(distance);
    let at = |t: f64| Ok((2.0 * t - t * t, 2.0 - 2.0 * t));
    let before = Node { time: 0.0, depth: 0.0, velocity: 2.0 };
    let after = Node { time: 1.9, depth: 0.19, velocity: -1.8 };
    let (end, place) = kind_and_place(locate(|x, v| law(0.75).force(x, v), 0.75, before, after, at).unwrap());
    assert_eq!((end, place.depth), ("limit", 0.75));
    assert!((place.time - 0.5).abs() < 1e-15 && (place.velocity - 1.0).abs() < 1e-15, "{place:?}");
    let (end, place) = kind_and_place(locate(|x, v| law(1.25).force(x, v), 1.25, before, after, at).unwrap());
    assert_eq!((end, place.velocity), ("rest", 0.0));
    assert!((place.time - 1.0).abs() < 1e-15 && (place.depth - 1.0).abs() < 1e-15, "{place:?}");
    // Touching counts as reached.
    let (end, place) = kind_and_place(locate(|x, v| law(1.0).force(x, v), 1.0, before, after, at).unwrap());
    assert_eq!(end, "limit");
    assert!(place.velocity.abs() < 1e-7, "{place:?}");
}

#[test]
fn bracketed_root_is_exact_for_flat_and_steep_functions_whatever_the_slopes() {
    let node = |time| Node { time, depth: 0.0, velocity: 0.0 };
    // A time of a millionth has its digits too: no absolute width ends the search.
    let f = |node: Node| (node.time - 3e-7, 0.0);
    let root = bracketed_root(node(0.0), node(1e-6), 0.0, f, |t| Ok(node(t))).unwrap();
    assert!((root.time / 3e-7 - 1.0).abs() < 1e-15, "{root:?}");
    for exponent in [1, 3, 9, 31] {
        let value = |t: f64| (t - 0.3).powi(exponent);
        let slope = |t: f64| f64::from(exponent) * (t - 0.3).powi(exponent - 1);
        // Right, wrong, far too flat or steep, and none.
        for share in [1.0, -3.0, 1e-3, 1e3, 1e300, 0.0, f64::INFINITY, f64::NAN] {
            let f = |node: Node| (value(node.time), share * slope(node.time));
            let mut evaluations = 0;
            let at = |t| {
                evaluations += 1;
                Ok(node(t))
            };
            let root = bracketed_root(node(0.0), node(1.0), 0.0, f, at).unwrap();
            assert!(value(root.time).abs() < 1e-15, "{exponent}, {share}: {}", root.time);
            assert!(evaluations <= ROOT_EVALUATIONS_MAX);
        }
    }
}

#[test]
fn an_event_takes_few_evaluations_of_the_interpolant() {
    // u' = -(p + q u²) from u = 1 in one step past rest, and in one to a depth before it.
    let law = Stage::tunnel(1.0, 0.5);
    let (root, speed) = (0.5_f64.sqrt(), 0.5_f64.sqrt().atan());
    let u = |t: f64| (speed - root * t).tan() / root;
    let xi = |t: f64| 2.0 * ((speed - root * t).cos() / speed.cos()).ln();
    let rest = speed / root;
    let node = |share: f64| Node { time: share * rest, depth: xi(share * rest), velocity: u(share * rest) };
    // Rest, a boundary well before it, and one that it has all but reached.
    for (after, distance, most) in [(1.05, 1.0, 3), (0.95, xi(0.9 * rest), 3), (1.05, 0.999 * xi(rest), 12)] {
        let mut evaluations = 0;
        let at = |t: f64| {
            evaluations += 1;
            Ok((xi(t), u(t)))
        };
        let (end, place) =
            kind_and_place(locate(|x, v| law.force(x, v), distance, node(0.8), node(after), at).unwrap());
        assert_eq!(end, if distance == 1.0 { "rest" } else { "limit" });
        let f = if distance == 1.0 { u(place.time) } else { xi(place.time) - distance };
        assert!(f.abs() < 1e-15, "{place:?}");
        assert!(evaluations <= most, "{after}, {distance}: {evaluations}");
    }
}

#[test]
fn spring_stops_at_its_first_turning_point_even_at_a_tenth_of_accuracy() {
    for scheme in Scheme::ALL {
        // A far exit loosens the absolute tolerance of the depth, and with it the steps.
        for exit_depth in [f64::INFINITY, 1.0, 10.0, 100.0, 1e4] {
            let problem = of_stages(2.0, 3.0, exit_depth, &[stage(0.0, 50.0, 0.0, 0.0, f64::INFINITY)]);
            let flight = Diffsol::new(scheme, 0.1).solve(&problem, Detail::Events).unwrap();
            assert!((flight.end.depth / 0.6 - 1.0).abs() < 0.5, "{scheme:?} {exit_depth}: {}", flight.end);
            let time = std::f64::consts::FRAC_PI_2 / 5.0;
            assert!((flight.end.time / time - 1.0).abs() < 0.5, "{scheme:?} {exit_depth}: {}", flight.end);
        }
    }
}

#[test]
fn no_step_on_an_underdamped_spring_is_longer_than_the_longest() {
    for (s, r, longest) in [(4.0, 0.0, 0.5), (4.0, 3.9, 0.5), (4.0, 4.0, INF), (0.0, 0.0, INF)] {
        assert_eq!(law(1.0, s, r, 0.0).longest_step(), longest, "{s}, {r}");
    }
    // w = 5/s, driven: half a period lies before the turning point.
    let problem = of_stages(2.0, 0.01, 1e4, &[stage(-25.0, 50.0, 0.0, 0.0, f64::INFINITY)]);
    for scheme in Scheme::ALL {
        let flight = Diffsol::new(scheme, 0.1).solve(&problem, Detail::Trajectory).unwrap();
        let longest = flight.trajectory.windows(2).map(|rows| rows[1].state.time - rows[0].state.time);
        assert!(longest.fold(0.0, f64::max) <= 0.2 * (1.0 + 1e-12), "{scheme:?}");
        assert!(flight.outcome.is_stop() || flight.outcome == Outcome::Undecided, "{scheme:?}: {flight:?}");
    }
}

#[test]
fn pure_drag_reaches_every_depth() {
    // V = V0 exp(-q x/M): exp(-3) of the speed is left; exp(-60) is below the tolerance, and said to be.
    for scheme in Scheme::ALL {
        let at = |exit_depth| {
            let problem = of_stages(1.0, 1.0, exit_depth, &[stage(0.0, 0.0, 0.0, 1.0, f64::INFINITY)]);
            Diffsol::new(scheme, 1e-8).solve(&problem, Detail::Events).unwrap()
        };
        assert!((at(3.0).end.velocity - (-3.0_f64).exp()).abs() < 1e-6, "{scheme:?}");
        assert_eq!(at(3.0).outcome, Outcome::Perforated);
        assert_eq!(at(60.0).outcome, Outcome::Undecided, "{scheme:?}");
    }
}

#[test]
fn rest_that_an_explicit_step_hides_in_its_middle_is_found() {
    // Past rest the law would creep back at p/r, far below the tolerance: at the stability limit of the method u is
    // then positive at every step's end while xi falls for ever.
    let mut random = Random::new(5);
    for _ in 0..300 {
        let viscosity = random.log_uniform(3.0, 300.0);
        let law = stage(viscosity * random.log_uniform(1e-6, 1e-2), 0.0, viscosity, 0.0, f64::INFINITY);
        let method = Diffsol { max_steps: 1000, ..Diffsol::new(Scheme::Tsit45, 1e-3) };
        let flight = method.solve(&of_stages(1.0, 1.0, 1.0, &[law]), Detail::Events).unwrap();
        assert!(matches!(flight.outcome, Outcome::Stopped | Outcome::Undecided), "{law:?}: {flight:?}");
        let z = viscosity / law.static_force;
        let exact = (z - z.ln_1p()) / (z * viscosity);
        assert!((flight.end.depth - exact).abs() < 1e-2, "{law:?}: {} not {exact}", flight.end);
        assert!(flight.cost.rejected_steps < 1000, "{law:?}: {:?}", flight.cost);
    }
}

#[test]
fn drive_whose_speed_is_lost_in_the_tolerance_is_undecided_and_no_stop() {
    // It leaves at the terminal velocity 1e-7 V0, which rtol 1e-3 cannot distinguish from rest.
    let problem = of_stages(1.0, 1.0, 0.02, &[stage(-1e-5, 0.0, 100.0, 0.0, f64::INFINITY)]);
    for scheme in Scheme::ALL {
        let flight = Diffsol::new(scheme, 1e-3).solve(&problem, Detail::Events).unwrap();
        assert_eq!(flight.outcome, Outcome::Undecided, "{scheme:?}: {flight:?}");
    }
}

#[test]
fn overdamped_spring_that_only_resists_comes_to_rest_at_any_tolerance() {
    // Rest after ln(l1/l2)/(l1 - l2), about M V0/r deep: far below rtol times the exit depth.
    let problem = of_stages(1.0, 1.0, 5.0, &[stage(0.0, 1.0, 2e4, 0.0, f64::INFINITY)]);
    for scheme in Scheme::ALL {
        for rtol in [1e-2, 1e-3, 1e-6, 1e-9] {
            let flight = Diffsol::new(scheme, rtol).solve(&problem, Detail::Events).unwrap();
            assert_eq!(flight.outcome, Outcome::Stopped, "{scheme:?} {rtol}");
            assert!((flight.end.depth - 5e-5).abs() < 50.0 * rtol, "{scheme:?} {rtol}: {}", flight.end);
        }
    }
}

#[test]
fn step_budget_is_kept_and_reported() {
    let method = Diffsol { max_steps: 5, ..Diffsol::new(Scheme::Bdf, 1e-10) };
    let error = method.solve(&tunnel(f64::INFINITY), Detail::Events).unwrap_err();
    let IntegrationError::StepBudgetSpent { max_steps, last, .. } = error else { panic!("{error}") };
    assert_eq!(max_steps, 5);
    assert!(last.depth > 0.0 && last.velocity > 0.0, "{last}");
}

#[test]
fn tolerances_at_the_end_of_the_range_give_a_flight() {
    for scheme in Scheme::ALL {
        for rtol in [0.1, 1e-13, scheme.rtol_min()] {
            let flight = Diffsol::new(scheme, rtol).solve(&tunnel(0.14), Detail::Events).unwrap();
            let error = (flight.exit_margin.unwrap() - exact_margin(&tunnel(0.14))).abs();
            assert!(error < flight.exit_margin_error.unwrap(), "{scheme:?} {rtol}: {flight:?}");
            assert_eq!(flight.outcome == Outcome::Perforated, rtol < 1e-3, "{scheme:?} {rtol}");
        }
    }
}

#[test]
fn tolerance_outside_its_range_is_refused() {
    for scheme in Scheme::ALL {
        for rtol in [0.0, -1e-6, 0.9 * scheme.rtol_min(), 0.11, f64::NAN, f64::INFINITY] {
            let error = Diffsol::new(scheme, rtol).solve(&tunnel(0.1), Detail::End).unwrap_err();
            assert!(error.is_usage(), "{rtol}: {error}");
        }
    }
}

const INF: f64 = f64::INFINITY;

/// By the energy, which is exact to round-off.
fn exact_margin(problem: &Problem) -> f64 {
    Energy::new().exit_margin_in(problem).unwrap().unwrap().0
}

fn law(p: f64, s: f64, r: f64, q: f64) -> Stage {
    stage(p, s, r, q, INF)
}

#[test]
fn a_stage_without_finite_numbers_in_its_units_is_not_solved() {
    for law in
        [law(1e300, 0.0, 0.0, 0.0), law(0.0, 1e300, 0.0, 0.0), law(0.0, 0.0, 1e300, 0.0), law(0.0, 0.0, 0.0, 1e300)]
    {
        let problem = of_stages(1e-10, 1.0, 1.0, &[law]);
        let error = Diffsol::new(Scheme::Tsit45, 1e-6).solve(&problem, Detail::End).unwrap_err();
        assert!(
            matches!(error, IntegrationError::NotFinite { what: "the force over the mass", .. }),
            "{law:?}: {error}"
        );
    }
}

#[test]
fn speed_hangs_where_no_static_force_is_left_and_a_creep_ends_where_the_drive_does() {
    for hangs in [law(0.0, 0.0, 1.0, 0.0), law(0.0, 4.0, 0.0, 0.0), law(-1.0, 4.0, 4.0, 0.0)] {
        assert!(hangs.may_hang(), "{hangs:?}");
    }
    for ends in [law(-1.0, 4.0, 3.0, 0.0), law(-1.0, 0.0, 1.0, 0.0), law(1.0, 4.0, 9.0, 0.0)] {
        assert!(!ends.may_hang(), "{ends:?}");
    }
    let at = |xi: f64, u: f64| Node { time: 0.0, depth: xi, velocity: u };
    for (law, at, reach) in [
        (law(-8.0, 2.0, 1.0, 0.0), at(1.0, 3.0), 3.0),
        (law(-8.0, 2.0, 1.0, 0.0), at(5.0, 3.0), 0.0),
        (law(-8.0, 0.0, 1.0, 0.0), at(1.0, 3.0), INF),
        (law(0.0, 2.0, 2.0, 0.0), at(1.0, 3.0), 1.5),
        (law(0.0, 0.0, 0.0, 1.0), at(1.0, 3.0), INF),
    ] {
        assert_eq!(law.reach(at), reach, "{law:?}");
    }
}

#[test]
fn first_step_is_a_share_of_the_fastest_time_that_keeps_its_local_error_at_the_tolerance() {
    for (law, u, distance, time) in [
        (law(0.0, 0.0, 0.0, 0.0), 2.0, 0.5, 0.25),
        (law(-3.0, 0.0, 0.0, 0.0), 1.0, INF, 1.0 / 3.0),
        (law(-3.0, 0.0, 0.0, 0.0), 0.5, INF, 1.0 / 6.0),
        (law(-3.0, 0.0, 0.0, 0.0), 2.0, INF, 1.0 / 3.0),
        (law(0.0, 25.0, 0.0, 0.0), 1.0, INF, 0.2),
        (law(0.0, 0.0, 1.0, 2.0), 3.0, INF, 1.0 / 13.0),
        (law(0.0, 0.0, 0.0, 0.0), 0.0, 1.0, 1.0),
    ] {
        assert_eq!(law.until(distance).shortest_time(u), time, "{law:?}, {u}");
    }
    // Orders 5, 1, 3 and 2, at the tolerance asked of the library.
    for (scheme, rtol, share) in [
        (Scheme::Tsit45, 1e-6, 0.05),
        (Scheme::Bdf, 1e-6, 0.0005),
        (Scheme::Esdirk34, 1e-3, 0.05),
        (Scheme::TrBdf2, 1e-2 / 3.0, 0.5 * 1e-4_f64.cbrt()),
    ] {
        let off = scheme.first_step_share(rtol) / share - 1.0;
        assert!(off.abs() < 1e-14, "{scheme:?}: {off:e}");
    }
}

#[test]
fn unit_of_length_is_the_nearest_boundary_or_the_shortest_length_of_the_law() {
    let unit = |exit, stages: &[Stage]| length_of(&of_stages(2.0, 3.0, exit, stages));
    let still = stage(0.0, 0.0, 0.0, 0.0, INF);
    assert_eq!(unit(5.0, &[Stage { end: 0.0, ..still }, Stage { end: 4.0, ..still }, still]), 4.0);
    assert_eq!(unit(0.5, &[Stage { end: 4.0, ..still }, still]), 0.5);
    for (law, length) in [
        (stage(4.0, 0.0, 0.0, 0.0, INF), 2.25),
        (stage(-4.0, 0.0, 0.0, 0.0, INF), 2.25),
        (stage(0.0, 8.0, 0.0, 0.0, INF), 1.5),
        (stage(0.0, 0.0, 12.0, 0.0, INF), 0.5),
        (stage(0.0, 0.0, 0.0, 8.0, INF), 0.25),
        (stage(4.0, 8.0, 1.0, 0.0, INF), 1.5),
        (still, 1.0),
    ] {
        assert_eq!(unit(INF, &[law]), length, "{law:?}");
    }
    // M/q = 1e-330 m is less than any number.
    let light = Problem { mass: 1e-30, ..of_stages(1.0, 3.0, INF, &[stage(4.5e-30, 0.0, 0.0, 1e300, INF)]) };
    assert!((length_of(&light) - 1.0).abs() < 1e-15);
    let start = State { time: 1.0, depth: 10.0, velocity: 7.0 };
    let stage = Reduced { law: still, own: None, length: 2.0, unit_speed: 4.0, start, speed: 1.75, falls: false };
    let state = stage.state(Node { time: 3.0, depth: 5.0, velocity: 6.0 });
    assert_eq!(state, State { time: 2.5, depth: 20.0, velocity: 24.0 });
}

#[test]
fn standstill_is_a_rest_where_a_force_above_the_noise_holds_it() {
    let at = |xi: f64| Node { time: 1.0, depth: xi, velocity: -1e-9 };
    let (rest, boundary, approach) = ("rest", "limit", "approach");
    let noise = 0.01;
    for (law, xi, distance, end) in [
        // The static force resists from the start.
        (law(1.0, 0.0, 1.0, 0.0), 2.0, 9.0, rest),
        (law(0.0, 1.0, 1.0, 0.0), 2.0, 9.0, rest),
        // A drive that springs out of balance: -8 + 2 xi.
        (law(-8.0, 2.0, 1.0, 0.0), 4.01, 9.0, rest),
        (law(-8.0, 2.0, 1.0, 0.0), 3.99, 9.0, approach),
        (law(-8.0, 2.0, 1.0, 0.0), 3.99, 4.0, boundary),
        // Overdamped it may hang: the brake must exceed a hundredth of 8 + 2 xi.
        (law(-8.0, 2.0, 9.0, 0.0), 4.05, 9.0, approach),
        (law(-8.0, 2.0, 9.0, 0.0), 4.12, 9.0, rest),
        // Beyond its reach by the noise, a hundredth of 1 + xi, and by more.
        (law(-8.0, 2.0, 9.0, 0.0), 3.5, 4.044, boundary),
        (law(-8.0, 2.0, 9.0, 0.0), 3.5, 4.046, approach),
        (law(-8.0, 2.0, 9.0, 0.0), 1.0, 4.019, boundary),
        (law(-8.0, 2.0, 9.0, 0.0), 1.0, 4.022, approach),
        // A drive alone goes on for ever.
        (law(-8.0, 0.0, 1.0, 0.0), 1.0, 9.0, boundary),
        (law(-8.0, 0.0, 1.0, 0.0), 1.0, INF, approach),
    ] {
        let (found, place) = kind_and_place(law.until(distance).meaning_of_standstill(at(xi), noise));
        assert_eq!(found, end, "{law:?}, {xi}, {distance}");
        let (depth, speed) = match end {
            "limit" => (distance, 0.0),
            "rest" => (xi, 0.0),
            _ => (xi, -1e-9),
        };
        assert_eq!((place.depth, place.velocity), (depth, speed));
    }
}

#[test]
fn speed_is_lost_below_ten_tolerances_of_the_greatest() {
    assert!(is_lost(0.3, 0.01, 9.0) && !is_lost(0.31, 0.01, 9.0));
    assert!(is_lost(0.9e-5, 1e-6, 1.0) && !is_lost(1.1e-5, 1e-6, 1.0));
}

#[test]
fn the_bar_holds_the_rounding_of_a_depth_that_is_long_beside_what_is_left() {
    let mut random = Random::new(23);
    let mut stops = 0;
    for _ in 0..100 {
        // What is left after 0.1 MN over a tenth of a metre, taken within about a nanometre: 4e7 spacings of depth.
        let exit_depth: f64 = 0.1 + 1e-9;
        let force = 0.98e6 / (2.0 * (exit_depth - 0.1)) * random.uniform(0.9, 1.5);
        let stages = [stage(0.1e6, 0.0, 0.0, 0.0, 0.1), stage(force, 0.0, 0.0, 0.0, INF)];
        let problem = of_stages(1.0, 1e3, exit_depth, &stages);
        let margin = exact_margin(&problem);
        for scheme in Scheme::ALL {
            let flight = Diffsol::new(scheme, 1e-12).solve(&problem, Detail::End).unwrap();
            let (found, bar) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap());
            assert!((found - margin).abs() <= bar, "{scheme:?}: {found} +- {bar}, not {margin}");
            assert!(bar < 1e-6, "{scheme:?}: {bar}");
            stops += u32::from(flight.outcome == Outcome::Stopped);
        }
    }
    assert!(stops > 200, "{stops} stops");
}

#[test]
fn a_leg_adds_to_the_bar_by_the_energy_that_is_left_at_its_start() {
    // W falls from 1 to 0.01 in the first metre: 50 N/kg of 99 percent of half V0².
    let stages = [stage(0.495, 0.0, 0.0, 0.0, 1.0), stage(1e-3, 0.0, 0.0, 0.0, INF)];
    for speed in [1.0, 1e3] {
        let stages = stages.map(|law| Stage { static_force: law.static_force * speed * speed, ..law });
        let problem = of_stages(1.0, speed, 2.0, &stages);
        for scheme in Scheme::ALL {
            let flight = Diffsol::new(scheme, 1e-6).solve(&problem, Detail::End).unwrap();
            let parts = flight.exit_margin_error.unwrap() / scheme.margin_error(1e-6);
            assert!((parts - 1.01).abs() < 1e-3, "{scheme:?}: {parts}");
        }
    }
}

#[test]
fn an_explicit_flight_evaluates_the_force_once_a_leg_and_six_times_a_step_taken_or_not() {
    let mut random = Random::new(31);
    let mut rejected = 0;
    for _ in 0..100 {
        let problem = random_concrete(&mut random);
        for rtol in [1e-2, 1e-5, 1e-9] {
            let flight = Diffsol::new(Scheme::Tsit45, rtol).solve(&problem, Detail::Trajectory).unwrap();
            let Cost { steps, rejected_steps, force_evaluations } = flight.cost;
            let stages = 1 + flight.stage as u64;
            // One at the start of each stage, and one in which the library makes the first solver.
            assert_eq!(force_evaluations, 1 + stages + 6 * (steps + rejected_steps), "{:?}", flight.cost);
            // Impact, every step but the last of each stage, which ends in its event, and the events.
            let samples = 1 + steps - stages + flight.events.len() as u64;
            assert_eq!(flight.trajectory.len() as u64, samples, "{:?}", flight.events);
            rejected += rejected_steps;
        }
    }
    assert!(rejected > 0, "no step was rejected");
    // Speed that is lost in the tolerance ends a stage in a step that counts too.
    let problem = of_stages(1.0, 1.0, 1.0, &[stage(5.9e-7, 0.0, 1360.0, 0.0, INF)]);
    let flight = Diffsol::new(Scheme::Tsit45, 0.1).solve(&problem, Detail::Trajectory).unwrap();
    assert_eq!(flight.trajectory.len() as u64, flight.cost.steps + 1, "{:?}", flight.cost);
}

#[test]
fn a_step_that_is_tried_again_is_counted_and_time_goes_on_from_where_it_began() {
    // A drag of 3e26/m beside a spring of 7e28/m²: the Newton iterations leave more of x open than a step moves.
    let problem =
        of_stages(1.0, 1.0, 1.0, &[stage(0.0, 6.859_735_044_546_989e28, 1.65, 2.987_378_155_631_558e26, INF)]);
    for scheme in [Scheme::Bdf, Scheme::Esdirk34] {
        let Ok(flight) = Diffsol::new(scheme, 1e-2).solve(&problem, Detail::Trajectory) else { panic!("{scheme:?}") };
        let rises = flight.trajectory.windows(2).all(|pair| pair[0].state.time <= pair[1].state.time);
        assert!(rises, "{scheme:?}");
        assert!(flight.cost.rejected_steps > 0, "{scheme:?}: {:?}", flight.cost);
    }
}
