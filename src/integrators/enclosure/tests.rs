use twofloat::TwoFloat;

use super::*;
use crate::integrators::Taylor;
use crate::physics::reference::{self, ExactState, Source};
use crate::studies::random_problems::Kind;
use crate::testing::Random;

const KINDS: [Kind; 9] = [
    Kind::Crater,
    Kind::Tunnel,
    Kind::SpringAndDrag,
    Kind::Viscous,
    Kind::ViscousSpring,
    Kind::Driven,
    Kind::Several,
    Kind::SeveralViscous,
    Kind::Table,
];

fn holds(state: &State<Ball>, exact: &ExactState) -> bool {
    let pairs = [(state.time, &exact.time), (state.depth, &exact.depth), (state.velocity, &exact.velocity)];
    pairs.iter().all(|(ball, exact)| exact.lies_between(ball.interval()))
}

/// Width in spacings of `f64` at `scale`.
fn spacings(ball: Ball, scale: f64) -> f64 {
    let (low, high) = ball.interval();
    (high - low) / (scale.next_up() - scale)
}

#[test]
fn the_exact_flight_lies_in_every_enclosure() {
    let random = &mut Random::new(20_261_123);
    let mut seen = 0;
    for round in 0..12 {
        for kind in KINDS {
            let Some(problem) = kind.draw(random) else { continue };
            let Ok(exact) = reference::flight(Source::Problem(&problem)) else { continue };
            let case = format!("{kind:?} {round}: {problem:?}");
            let flight = Enclosure.enclose(&problem.cast(), Detail::Events).unwrap();
            seen += 1;
            assert_eq!((flight.outcome, flight.stage), (exact.outcome, exact.stage), "{case}");
            let ours: Vec<_> = flight.events.iter().map(|event| event.kind).collect();
            assert_eq!(ours, exact.events.iter().map(|event| event.kind).collect::<Vec<_>>(), "{case}");
            assert!(holds(&flight.end, &exact.end), "{case} {:?} {:?}", flight.end, exact.end);
            for (event, exact) in flight.events.iter().zip(&exact.events) {
                assert!(holds(&event.state, &exact.state), "{case} {event:?} {exact:?}");
            }
            let State { time, depth, velocity } = flight.end;
            let widths = [
                spacings(time, time.value()),
                spacings(depth, depth.value()),
                spacings(velocity, problem.impact_speed),
            ];
            assert!(widths.iter().all(|width| *width <= 4.0), "{widths:?} of {case}");
        }
    }
    assert!(seen > 80, "{seen}");
}

/// Of numbers that 29 digits are known of, the interval of 106 bits is asked, not that of `f64`.
#[test]
#[ignore = "a minute; .ci/run runs it"]
fn twenty_thousand_enclosures_hold_the_answer_in_double_double() {
    let random = &mut Random::new(99);
    let (mut seen, mut undecided, mut nearest) = (0, 0, 0.0_f64);
    while seen < 20_000 {
        for kind in KINDS {
            let Some(problem) = kind.draw(random) else { continue };
            let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events).unwrap();
            let flight = Enclosure.enclose(&problem.cast(), Detail::Events).unwrap();
            seen += 1;
            if flight.outcome == Outcome::Undecided {
                undecided += 1;
                continue;
            }
            if exact.outcome == Outcome::Undecided {
                continue;
            }
            assert_eq!(flight.outcome, exact.outcome, "{problem:?}");
            assert_eq!(flight.events.len(), exact.events.len(), "{problem:?}");
            for (event, exact) in flight.events.iter().zip(&exact.events) {
                let (ours, theirs) = (event.state, exact.state);
                for (ball, exact) in
                    [(ours.time, theirs.time), (ours.depth, theirs.depth), (ours.velocity, theirs.velocity)]
                {
                    let slack = 1e-26 * exact.hi().abs();
                    let distance = ((exact.hi() - ball.mid.hi) + (exact.lo() - ball.mid.lo)).abs();
                    assert!(distance <= ball.radius + slack, "{event:?} {exact:?} of {problem:?}");
                    if distance > slack {
                        nearest = nearest.max((distance - slack) / ball.radius);
                    }
                }
            }
        }
    }
    println!("{seen} problems, {undecided} undecided, errors come to {nearest:.3} of their bounds");
    assert!(undecided * 1000 < seen && nearest > 1e-3);
}

/// 4e-15 of V_c on either side.
#[test]
fn next_to_the_critical_velocity_the_outcome_is_proved() {
    for problem in [crate::testing::tunnel(0.14), crate::testing::tunnel(0.05), crate::testing::tunnel(0.1)] {
        let critical = crate::physics::closed_form::critical_of_stages(&problem).unwrap().velocity;
        for (speed, outcome) in [(critical * (1.0 - 4e-15), false), (critical * (1.0 + 4e-15), true)] {
            let flight = Enclosure.enclose(&Problem { impact_speed: speed, ..problem.clone() }.cast(), Detail::End);
            assert_eq!(flight.unwrap().outcome == Outcome::Perforated, outcome, "{problem:?}");
        }
    }
}
