#![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]
use super::*;
use crate::physics::Stage;
use crate::testing::{scene, stage};

fn problem(stages: &[Stage], impact_speed: f64, exit_depth: f64) -> Problem {
    Problem::of_stages(2.0, impact_speed, stages.iter().copied()).with_exit(exit_depth)
}

fn solved(problem: &Problem) -> ExactFlight {
    flight(Source::Problem(problem)).unwrap()
}

fn kinds(flight: &ExactFlight) -> Vec<EventKind> {
    flight.events.iter().map(|event| event.kind).collect()
}

/// Relative difference of two big floats.
fn apart(a: &Big, b: &Big) -> f64 {
    (magnitude(a - b) / magnitude(b.clone())).to_f64().value()
}

#[test]
fn elementary_functions_agree_with_the_library_and_with_identities() {
    for (numerator, denominator) in [(7, 9), (1, 1_000_003), (123_456, 7), (1, 1)] {
        let z = int(numerator, 256) / int(denominator, 256);
        assert!(apart(&atan(&z), &z.atan()) < 1e-70);
        let y = &z + int(1, 256);
        // Near one the roots cost sixteen bits and the argument its own twenty.
        assert!(apart(&ln(&y), &y.ln()) < 1e-64);
        assert!(apart(&ln(&y).exp(), &y) < 1e-64);
        for (sy, sx) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
            let (y, x) = (&z * int(sy, 256), int(sx, 256));
            assert!(apart(&atan2(&y, &x, 256), &y.atan2(&x)) < 1e-70, "{sy} {sx}");
        }
    }
    assert_eq!(atan2(&Big::ZERO, &int(-1, 256), 256), Big::pi(256));
    // Machin: pi/4 = 4 atan(1/5) - atan(1/239).
    let fraction = |n| int(1, 256) / int(n, 256);
    let machin = (atan(&fraction(5)) << 4) - (atan(&fraction(239)) << 2);
    assert!(apart(&machin, &Big::pi(256)) < 1e-75);
}

/// Whether the first 48 digits are those of `digits`.
fn assert_digits(exact: &Exact, digits: &str) {
    let shown = exact.to_decimal(50);
    let significant = |text: &str| text.trim_start_matches(['0', '.']).replace('.', "")[..48].to_owned();
    assert_eq!(significant(&shown), significant(digits), "{shown} is not {digits}");
}

#[test]
fn flights_have_the_50_digits_of_a_taylor_integration_of_the_equation_of_motion() {
    for line in include_str!("taylor_digits.txt").lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split(' ').collect();
        let [p, s, r, q, impact_speed] = [0, 1, 2, 3, 4].map(|column| words[column].parse().unwrap());
        let law = stage(p, s, r, q, f64::INFINITY);
        if words[5] != "-" {
            let rested = solved(&problem(&[law], impact_speed, f64::INFINITY));
            assert_eq!(rested.outcome, Outcome::Stopped);
            assert_digits(&rested.end.time, words[5]);
            assert_digits(&rested.end.depth, words[6]);
        }
        let left = solved(&problem(&[law], impact_speed, 0.25));
        assert_eq!(left.outcome, Outcome::Perforated);
        assert_digits(&left.end.time, words[7]);
        assert_digits(&left.end.velocity, words[8]);
    }
}

#[test]
fn quadrature_of_the_time_gives_the_closed_tunnel_time_to_rest_and_short_of_it() {
    let tunnel = Stage::tunnel(1e5, 3.0);
    let source = problem(&[tunnel], 300.0, 0.2);
    // To rest half of the digits are lost, where W is a small difference.
    for (exit_depth, limit) in [(0.2, 1e-113), (f64::INFINITY, 1e-55)] {
        let source = Problem { exit_depth, ..source.clone() };
        let exact = solved(&source);
        let model = Source::Problem(&source).model(384, None).unwrap();
        let start = Point { time: int(0, 384), depth: int(0, 384), velocity: model.problem.impact_speed.clone() };
        let summed = quadrature(&model, &model.problem.stages[0], &start, &exact.end.depth.0);
        let off = apart(&summed, &exact.end.time.0);
        assert!(off < limit, "{off:e}");
    }
}

#[test]
fn condition_numbers_of_a_constant_force_are_its_exponents() {
    // X = M V0²/(2 p), T = M V0/p.
    let by = conditions(Source::Problem(&problem(&[Stage::tunnel(1e5, 0.0)], 300.0, f64::INFINITY))).unwrap();
    let [depth, time, rest @ ..] = by;
    assert!((depth - 4.0).abs() < 4.0 * f64::EPSILON, "{by:?}");
    assert!((time - 3.0).abs() < 3.0 * f64::EPSILON, "{by:?}");
    assert_eq!(rest, [0.0; 3]);
    // V_c = sqrt(2 p H/M): three inputs of one half.
    let by = critical_condition(Source::Problem(&problem(&[Stage::tunnel(1e5, 0.0)], 300.0, 1.0))).unwrap();
    assert!((by - 1.5).abs() < 2.0 * f64::EPSILON, "{by}");
}

#[test]
fn errors_of_a_64_bit_number_are_measured_below_its_rounding() {
    let third = Exact(int(1, 256) / int(3, 256));
    // 1/3 rounds down by a third of 2^-54, a relative 2^-54.
    assert_eq!(third.relative_error(1.0 / 3.0), 2.0_f64.powi(-54));
    assert_eq!(third.relative_error(f64::NAN), f64::INFINITY);
    assert_eq!(Exact(Big::ZERO).relative_error(0.0), 0.0);
    assert_eq!(Exact(Big::ZERO).relative_error(1e-300), f64::INFINITY);
    assert_eq!(third.to_decimal(50), format!("0.{}", "3".repeat(50)));
}

#[test]
fn what_has_no_answer_is_an_error() {
    let free = Stage { static_force: 0.0, ..Stage::tunnel(0.0, 0.0) };
    let endless = problem(&[free], 10.0, f64::INFINITY);
    assert_eq!(flight(Source::Problem(&endless)), Err(ReferenceError::NeverEnds));
    assert_eq!(critical(Source::Problem(&endless)), Err(ReferenceError::NoCritical));
    let both = Stage { viscosity: 1.0, ..Stage::tunnel(1.0, 1.0) };
    let error = flight(Source::Problem(&problem(&[both], 10.0, 1.0))).unwrap_err();
    assert_eq!(error.to_string(), "no reference for stage 0: viscosity and drag act together");
}

/// Forrestal 1994 shot 14, as published: S = 12, k = 2.
fn shot_14(thickness: Option<f64>, criterion: Criterion) -> Scene {
    Scene { thickness, criterion, velocity: None, ..scene() }
}

#[test]
fn a_scene_has_the_50_digits_of_the_formulas_in_another_program() {
    // mpmath 1.3.0 at 70 digits, docs/theory.md, section 2, in its plain forms.
    let scene = shot_14(None, Criterion::FullDepth);
    let exact = flight(Source::Scene(&scene, 277.0)).unwrap();
    assert_digits(&exact.end.depth, "0.1671950802699606820281951756134182369920137166438979");
    assert_digits(&exact.end.time, "0.001122301305544897903917260544220359543407377520436004");
    assert_digits(&exact.crater_end().unwrap().velocity, "248.4003030578009719391434245885765193341631673876338");
    let scene = shot_14(Some(0.1), Criterion::FullDepth);
    let exact = critical(Source::Scene(&scene, 0.0)).unwrap();
    assert_digits(&exact.velocity, "198.2723996547944194740407906105459115520752497552203");
}

#[test]
fn at_the_critical_velocity_the_margin_is_zero_to_its_rounding_and_just_beyond_the_outcome_changes() {
    let scene = shot_14(Some(0.1), Criterion::FullDepth);
    let critical = critical(Source::Scene(&scene, 0.0)).unwrap().velocity.to_f64();
    let at = |speed| flight(Source::Scene(&scene, speed)).unwrap();
    let margin = at(critical).exit_margin.unwrap();
    assert!(margin.error_over(0.0, &Exact::one()) < 2.0 * f64::EPSILON);
    assert_eq!(at(critical.next_up()).outcome, Outcome::Perforated);
    assert_eq!(at(critical.next_down()).outcome, Outcome::StoppedInTunnel);
}

#[test]
fn the_ndrc_exit_depth_inverts_the_relation_on_both_branches() {
    let d = int(1, 256);
    // y = 2 gives e = 1.32 + 2.48 = 3.80; y = 1 gives e = 3.19 - 0.718 = 2.472.
    let ratio = |numerator, denominator| int(numerator, 256) / int(denominator, 256);
    assert!(apart(&ndrc_depth(&ratio(380, 100), &d, 256), &int(2, 256)) < 1e-75);
    assert!(apart(&ndrc_depth(&ratio(2472, 1000), &d, 256), &int(1, 256)) < 1e-75);
    // The first ends at e = 2.997945; just beyond, e = 3 and 3.2 give (e - 1.32)/1.24.
    for hundredths in [300, 320] {
        let y = ratio(hundredths - 132, 124);
        assert!(apart(&ndrc_depth(&ratio(hundredths, 100), &d, 256), &y) < 1e-75);
    }
    // Of two depths for e = 2.996 the smaller: 1.3498, not 1.3516.
    let shallow = ndrc_depth(&ratio(2996, 1000), &d, 256).to_f64().value();
    assert!(shallow > 1.348 && shallow < 1.35, "{shallow}");
    let scene = shot_14(Some(3.8 * 0.0269), Criterion::Ndrc);
    let exact = flight(Source::Scene(&scene, 500.0)).unwrap();
    assert!((exact.end.depth.to_f64() / 0.0538 - 1.0).abs() < 4.0 * f64::EPSILON);
}

/// Depth and velocity a time `t` after `from` under `law`: the power series of the equation of motion, sixty terms
/// in each of 64 parts. It knows no solution.
fn carried(law: &Stage, mass: f64, from: &ExactState, t: &Big) -> (Big, Big) {
    let [p, s, r, q, mass] =
        [law.static_force, law.stiffness, law.viscosity, law.drag, mass].map(|value| big(value, 256));
    let leg = t.clone().with_precision(256).value() / int(64, 256);
    let (mut depth, mut velocity) = (from.depth.0.clone(), from.velocity.0.clone());
    for _ in 0..64 {
        let (mut x, mut v) = (vec![depth], vec![velocity]);
        for n in 0..60 {
            let mut force = &s * &x[n] + &r * &v[n];
            if n == 0 {
                force += &p;
            }
            if !is_zero(&q) {
                force += &q * (0..=n).fold(Big::ZERO, |sum, k| sum + &v[k] * &v[n - k]);
            }
            let next = int(i32::try_from(n + 1).unwrap(), 256);
            x.push(&v[n] * &leg / &next);
            v.push(-(force * &leg / (&mass * &next)));
        }
        let sum = |terms: &[Big]| terms.iter().rev().fold(int(0, 256), |sum, term| sum + term);
        (depth, velocity) = (sum(&x), sum(&v));
    }
    (depth, velocity)
}

/// The flight of `problem`, seen to solve the equation of motion from each event to the next, to 48 digits.
fn checked(problem: &Problem) -> ExactFlight {
    let flight = solved(problem);
    let zero = Exact(int(0, 256));
    let mut from = ExactState { time: zero.clone(), depth: zero, velocity: flight.impact_speed.clone() };
    for ExactEvent { kind, state: to } in &flight.events {
        let place = match kind {
            EventKind::Exit => Some(problem.exit_depth),
            EventKind::StageEnd(index) => Some(problem.stages[*index].end),
            _ => None,
        };
        assert_eq!(place.map_or(0.0, |place| to.depth.relative_error(place)), 0.0, "{kind:?}");
        let middle = half(&from.depth.0 + &to.depth.0).to_f64().value();
        let law = problem.stages.iter().find(|law| law.end > middle).unwrap();
        let (depth, velocity) = carried(law, problem.mass, &from, &(&to.time.0 - &from.time.0));
        let off = [(depth, &to.depth, &flight.end.depth), (velocity, &to.velocity, &flight.impact_speed)]
            .map(|(found, expected, scale)| (magnitude(found - &expected.0) / &scale.0).to_f64().value());
        assert!(off[0] < 1e-48 && off[1] < 1e-48, "{kind:?}: {off:?}");
        from = to.clone();
    }
    assert_eq!(flight.end, from);
    flight
}

#[test]
fn flights_solve_the_equation_of_motion_from_event_to_event() {
    let none = f64::INFINITY;
    let cases: [(&[Stage], f64, f64, Outcome); 6] = [
        // Spring and drag together, from a depth of their own.
        (&[stage(0.0, 0.0, 0.0, 0.0, 1.0), stage(2.0, 2.0, 0.0, 0.25, none)], 1.0, none, Outcome::Stopped),
        // Critically damped: at rest, and before it.
        (&[stage(100.0, 8.0, 8.0, 0.0, none)], 10.0, none, Outcome::Stopped),
        (&[stage(100.0, 8.0, 8.0, 0.0, none)], 10.0, 0.25, Outcome::Perforated),
        // All kinds in a row, each from where the one before leaves off.
        (
            &[
                stage(10.0, 0.0, 0.0, 0.5, 0.125),
                stage(0.0, 50.0, 0.0, 0.0, 0.25),
                stage(-40.0, 0.0, 0.0, 0.5, 0.375),
                stage(20.0, 0.0, 3.0, 0.0, 0.5),
                stage(100.0, 8.0, 8.0, 0.0, 0.625),
                stage(100.0, 50.0, 3.0, 0.0, none),
            ],
            10.0,
            none,
            Outcome::Stopped,
        ),
        (
            &[stage(0.0, 0.0, 0.0, 0.5, 0.125), stage(5.0, 0.0, 0.0, 0.0, 0.25), stage(100.0, 50.0, 40.0, 0.0, none)],
            10.0,
            0.375,
            Outcome::Perforated,
        ),
        (&[stage(0.0, 0.0, 3.0, 0.0, 0.125), stage(3.0, 0.0, 2.0, 0.0, none)], 1.0, none, Outcome::Stopped),
    ];
    for (list, impact_speed, exit_depth, outcome) in cases {
        let flight = checked(&problem(list, impact_speed, exit_depth));
        assert_eq!((flight.outcome, flight.stage), (outcome, list.len() - 1));
    }
}

#[test]
fn rest_under_spring_and_drag_is_the_zero_of_the_series_of_w() {
    // dW/dx = -2 (p + s x + q W)/M as a power series about the start, which converges everywhere. Light and heavy,
    // weak and stiff, with the drag without account or nearly alone.
    let none = f64::INFINITY;
    for (mass, speed, start, law) in [
        (2.0, 1.0, 1.0, stage(2.0, 2.0, 0.0, 0.25, none)),
        (2.0, 1.0, 0.0, stage(1.0, 0.25, 0.0, 0.5, none)),
        (2.0, 4.0, 0.0, stage(0.5, 0.25, 0.0, 0.01, none)),
        (2.0, 0.7, 0.0, stage(0.1, 1.0, 0.0, 0.1, none)),
        (2.0, 6.0, 0.0, stage(3.0, 4.0, 0.0, 0.01, none)),
        (1024.0, 1.0, 0.0, stage(1.0, 1.0, 0.0, 1.0, none)),
        (2.0, 1.0, 0.0, stage(1.0, 1_048_576.0, 0.0, 1.0, none)),
        (2.0, 0.0625, 0.0, stage(1.0, 1.0, 0.0, 1024.0, none)),
    ] {
        let source = Problem { mass, ..problem(&[law], speed, none) };
        let model = Source::Problem(&source).model(256, None).unwrap();
        let from = Point { time: int(0, 256), depth: big(start, 256), velocity: big(speed, 256) };
        let depth = rest_depth(&model, &model.problem.stages[0], &from).unwrap();
        let xi = &depth - &from.depth;
        let Stage { static_force: p, stiffness: s, drag: q, .. } = &model.problem.stages[0];
        let mut term = square(&from.velocity);
        let mut w = term.clone();
        for n in 0..150 {
            let force = match n {
                0 => p + s * &from.depth + q * &term,
                1 => s * &xi + q * &term,
                _ => q * &term,
            };
            term = -(twice(force * &xi) / (&model.problem.mass * int(n + 1, 256)));
            w += &term;
        }
        let left = (magnitude(w) / square(&from.velocity)).to_f64().value();
        assert!(is_positive(&xi) && left < 1e-70, "{law:?}: {left:e}");
    }
}

#[test]
fn a_linear_dashpot_is_crossed_in_a_logarithm_at_any_speed() {
    // M = r = 2: V = V0 - x and t = ln(V0/V), so half of V0 is left after x = V0/2 and t = ln 2.
    for exponent in [-60, 0, 200] {
        let impact_speed = 2.0_f64.powi(exponent);
        let exact = solved(&problem(&[stage(0.0, 0.0, 2.0, 0.0, f64::INFINITY)], impact_speed, 0.5 * impact_speed));
        assert!(apart(&exact.end.time.0, &int(2, 384).ln()) < 1e-50);
        assert!(exact.end.velocity.relative_error(0.5 * impact_speed) < 1e-50);
    }
}

#[test]
fn stage_ends_at_one_place_are_each_told_with_or_without_speed_and_before_the_exit() {
    let law = |end| stage(64.0, 0.0, 0.0, 0.0, end);
    let none = f64::INFINITY;
    let [first, second] = [EventKind::StageEnd(0), EventKind::StageEnd(1)];
    // M = 2, V0 = 8: rest at x = 1.
    let rest = solved(&problem(&[law(1.0), law(1.0), law(none)], 8.0, none));
    assert_eq!((kinds(&rest), rest.stage), (vec![first, second, EventKind::Rest], 0));
    for (list, exit_depth, events, stage) in [
        (vec![law(1.0), law(1.0), law(none)], 1.0, vec![first, second, EventKind::Exit, EventKind::Rest], 0),
        (vec![law(0.5), law(0.5), law(none)], 0.5, vec![first, second, EventKind::Exit], 0),
        (vec![law(0.5), law(0.75), law(none)], 0.5, vec![first, EventKind::Exit], 0),
        (vec![law(0.5), law(0.5), law(none)], 0.75, vec![first, second, EventKind::Exit], 2),
        (vec![law(0.5), law(none)], 0.25, vec![EventKind::Exit], 0),
        (vec![law(0.0), law(0.0), law(none)], 0.0, vec![first, second, EventKind::Exit], 2),
        (vec![law(0.0), law(0.5), law(none)], 0.0, vec![first, EventKind::Exit], 1),
        (vec![law(0.5), law(none)], 0.0, vec![EventKind::Exit], 0),
    ] {
        let exact = solved(&problem(&list, 8.0, exit_depth));
        assert_eq!((exact.outcome, kinds(&exact), exact.stage), (Outcome::Perforated, events, stage), "{list:?}");
    }
}

#[test]
fn a_tie_is_reached_with_no_speed_left_seen_through_rounding_and_its_condition_is_infinite() {
    // w = 10 and V0 = 10: X = 1 in either sense, at the end of the crater.
    let list = [Stage::crater(100.0, 1.0), Stage::tunnel(100.0, 1.0)];
    for (exit_depth, outcome, last) in [
        (2.0, Outcome::StoppedInCrater, &[EventKind::Rest][..]),
        (1.0, Outcome::Perforated, &[EventKind::Exit, EventKind::Rest]),
    ] {
        let (crater, target) = (Some(0), Target::CraterAndTunnel);
        let exact = solved(&Problem { mass: 1.0, crater, target, ..problem(&list, 10.0, exit_depth) });
        assert_eq!((exact.outcome, exact.end.velocity.to_f64()), (outcome, 0.0));
        assert_eq!(kinds(&exact), [&[EventKind::CraterEnd], last].concat());
    }
    let none = f64::INFINITY;
    let [inner, exit, rest] = [EventKind::StageEnd(0), EventKind::Exit, EventKind::Rest];
    // W falls from 1 to 1 - 1/M at x = 1/2, which no binary number is, and to 0 at x = 1.
    for mass in [3.0, 5.0, 7.0, 11.0, 13.0] {
        let list = [stage(1.0, 0.0, 0.0, 0.0, 0.5), stage(mass - 1.0, 0.0, 0.0, 0.0, none)];
        let tie = Problem { mass, ..problem(&list, 1.0, 1.0) };
        let exact = solved(&tie);
        assert_eq!((exact.outcome, kinds(&exact)), (Outcome::Perforated, vec![inner, exit, rest]), "{mass}");
        assert_eq!(exact.end.velocity.to_f64(), 0.0);
        assert_eq!(conditions(Source::Problem(&tie)).unwrap()[0], f64::INFINITY);
    }
    // M x'' = -(2 + 2 x + 3 x'), M = 1, V0 = 3: u = x + 1 = 5 e^-t - 4 e^-2t, whose largest value is 25/16 at e^-t = 5/8.
    let damped = Problem { mass: 1.0, ..problem(&[stage(2.0, 2.0, 3.0, 0.0, none)], 3.0, 9.0 / 16.0) };
    let exact = solved(&damped);
    assert_eq!((exact.outcome, kinds(&exact)), (Outcome::Perforated, vec![exit, rest]));
    assert_eq!(exact.end.velocity.to_f64(), 0.0);
    assert!(apart(&exact.end.time.0, &(int(8, 384) / int(5, 384)).ln()) < 1e-50);
    // What is left of W is small beside W0 only: 2^350 of 2^400.
    let fast = 2.0_f64.powi(200);
    let force = fast * fast * (1.0 - 2.0_f64.powi(-50));
    let exact = solved(&problem(&[stage(force, 0.0, 0.0, 0.0, none)], fast, 1.0));
    assert_eq!(exact.end.velocity.to_f64(), 2.0_f64.powi(175));
}

#[test]
fn two_precisions_agree_when_course_and_every_number_do() {
    let at = |n| exact(&Point { time: int(n, 256), depth: int(n + 1, 256), velocity: int(n + 2, 256) });
    let raw = |edit: &dyn Fn(&mut ExactFlight)| {
        let mut raw = ExactFlight {
            outcome: Outcome::Stopped,
            stage: 1,
            end: at(4),
            events: [(EventKind::StageEnd(0), at(1)), (EventKind::Rest, at(4))]
                .map(|(kind, state)| Event { kind, state })
                .into(),
            exit_margin: Some(Exact(half(int(1, 256)))),
            impact_speed: Exact(int(9, 256)),
        };
        edit(&mut raw);
        raw
    };
    let base = raw(&|_| ());
    let other: [&dyn Fn(&mut ExactFlight); 12] = [
        &|raw| raw.outcome = Outcome::Perforated,
        &|raw| raw.stage = 0,
        &|raw| raw.events[0].kind = EventKind::CraterEnd,
        &|raw| drop(raw.events.pop()),
        &|raw| raw.events[0].state.time.0 += Big::ONE,
        &|raw| raw.events[0].state.depth.0 += Big::ONE,
        &|raw| raw.events[1].state.velocity.0 += Big::ONE,
        &|raw| raw.end.time.0 += Big::ONE,
        &|raw| raw.end.depth.0 += Big::ONE,
        &|raw| raw.end.velocity.0 += Big::ONE,
        &|raw| raw.exit_margin = Some(Exact(Big::ONE)),
        &|raw| raw.exit_margin = None,
    ];
    for (number, edit) in other.into_iter().enumerate() {
        assert!(!base.agrees(&raw(edit)) && !raw(edit).agrees(&base), "{number}");
    }
    let last_digits = |raw: &mut ExactFlight| {
        for state in [&mut raw.end, &mut raw.events[0].state] {
            state.time.0 += Big::ONE >> 174;
            state.depth.0 += Big::ONE >> 174;
            state.velocity.0 += Big::ONE >> 174;
        }
    };
    assert!(base.agrees(&raw(&last_digits)));
    let course: [&dyn Fn(&mut ExactFlight); 3] = [other[0], other[1], other[2]];
    assert!(base.same_course(&raw(other[4])) && course.iter().all(|edit| !base.same_course(&raw(edit))));
    // A margin agrees in its own digits, or in 52 digits of one.
    let power = |exponent: isize| int(1, 256) >> exponent;
    let margins = |a: Option<Big>, b: Option<Big>| {
        let with = |margin: Option<Big>| raw(&|raw| raw.exit_margin = margin.clone().map(Exact));
        with(a).agrees(&with(b))
    };
    assert!(margins(None, None));
    assert!(margins(Some(power(-100)), Some(power(-100) + power(80))));
    assert!(margins(Some(power(300)), Some(power(200))));
    assert!(margins(Some(power(175)), Some(-power(175))));
    assert!(!margins(Some(power(173)), Some(Big::ZERO)));
    assert!(!margins(Some(power(100)), Some(-power(100))));
    assert!(!margins(Some(power(100)), Some(power(99))));
}

#[test]
fn agreement_is_52_digits_and_more_bits_are_tried_until_it_is_reached() {
    let one = int(1, 512);
    assert!(agree(&(&one + (one.clone() >> 174)), &one));
    assert!(!agree(&(&one + (one.clone() >> 173)), &one));
    assert!(!agree(&int(2, 256), &one) && !agree(&one, &int(2, 256)));
    assert!(agree(&Big::ZERO, &Big::ZERO) && !agree(&one, &Big::ZERO));
    // Half of the bits distinguish a difference from zero.
    assert!(vanishes(&(one.clone() >> 128), &one, 256) && !vanishes(&(one >> 127), &int(1, 256), 256));
    assert_eq!(at_enough_bits(Ok, |_, _| true), Ok(([256, 384], 256)));
    assert_eq!(at_enough_bits(Ok, |a, _| *a > 500), Ok(([576, 864], 576)));
    assert_eq!(at_enough_bits(Ok, |_, _| false), Err(ReferenceError::Undecided(6561)));
}

#[test]
fn one_input_at_a_time_is_moved_up_by_2_to_the_minus_80() {
    let source = problem(&[Stage::tunnel(1e5, 0.0)], 300.0, 1.0);
    let source = Source::Problem(&source);
    let numbers = |moved| {
        let Problem { mass, impact_speed, exit_depth, stages, .. } = source.model(256, moved).unwrap().problem;
        [mass, impact_speed, exit_depth, stages[0].static_force.clone(), stages[0].drag.clone()]
    };
    // Mass, impact speed, exit depth and static force; the coefficients that are zero stay so.
    assert_eq!(source.moving_inputs(), Ok(vec![0, 1, 2, 3]));
    for moving in 0..4 {
        for (i, (after, before)) in numbers(Some(moving)).iter().zip(&numbers(None)).enumerate() {
            let step = if i == moving { before.clone() >> 80 } else { Big::ZERO };
            assert_eq!(after - before, step, "input {i}, step {moving}");
        }
    }
}

#[test]
fn a_viscous_stage_of_no_depth_leaves_the_critical_velocity_as_it_is() {
    // V_c² = 2 p H/M = 9.
    let tunnel = Stage::tunnel(3.0, 0.0);
    let viscous = |end| stage(1.0, 0.0, 5.0, 0.0, end);
    for list in [vec![viscous(0.0), tunnel], vec![Stage { end: 1.0, ..tunnel }, viscous(1.0), tunnel]] {
        let critical = critical(Source::Problem(&problem(&list, 0.0, 3.0))).unwrap();
        assert_eq!((critical.velocity.to_f64(), critical.energy.to_f64()), (3.0, 9.0));
    }
    let thick = problem(&[viscous(1.0), tunnel], 0.0, 3.0);
    assert_eq!(critical(Source::Problem(&thick)), Err(ReferenceError::NoCritical));
}
