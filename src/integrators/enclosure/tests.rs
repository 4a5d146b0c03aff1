use super::*;
use crate::physics::reference::{self, ExactState, Source};
use crate::physics::{Event, Outcome};
use crate::studies::random_problems::Kind;
use crate::testing::Random;

/// Width of an interval in spacings of its middle; of zero, none.
fn spacings((low, high): (f64, f64)) -> f64 {
    let size = low.abs().max(high.abs());
    if low == high { 0.0 } else { (high - low) / (size.next_up() - size) }
}

fn holds(state: &State<Ball>, exact: &ExactState) -> bool {
    let pairs = [(state.time, &exact.time), (state.depth, &exact.depth), (state.velocity, &exact.velocity)];
    pairs.iter().all(|(ball, exact)| exact.lies_between(ball.interval()))
}

#[test]
fn the_exact_flight_lies_in_every_enclosure() {
    let kinds = [
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
    let random = &mut Random::new(20_261_123);
    let (mut seen, mut undecided, mut unsupported) = (0, 0, 0);
    let mut widths = Vec::new();
    for round in 0..40 {
        for kind in kinds {
            let Some(problem) = kind.draw(random) else { continue };
            let case = format!("{kind:?} {round}: {problem:?}");
            let Ok(exact) = reference::flight(Source::Problem(&problem)) else {
                unsupported += 1;
                continue;
            };
            let flight = Enclosure.enclose(&problem.cast(), Detail::Events).unwrap_or_else(|e| panic!("{e} {case}"));
            seen += 1;
            assert!(holds(&flight.end, &exact.end), "{case} {:?} {:?}", flight.end, exact.end);
            if flight.outcome == Outcome::Undecided {
                undecided += 1;
                eprintln!("undecided {case}");
                continue;
            }
            assert_eq!((flight.outcome, flight.stage), (exact.outcome, exact.stage), "{case}");
            let kinds = |events: Vec<_>| events;
            let ours = kinds(flight.events.iter().map(|event: &Event<Ball>| event.kind).collect());
            assert_eq!(ours, exact.events.iter().map(|event| event.kind).collect::<Vec<_>>(), "{case}");
            for (event, exact) in flight.events.iter().zip(&exact.events) {
                assert!(holds(&event.state, &exact.state), "{case} {event:?} {exact:?}");
            }
            let State { time, depth, velocity } = flight.end;
            widths.push([time, depth, velocity].map(|ball| spacings(ball.interval())));
            let widest = widths.last().unwrap().iter().fold(0.0, |a: f64, b| a.max(*b));
            if widest > 8.0 {
                eprintln!("{widest} {} steps, {case}", flight.cost.steps);
            }
        }
    }
    eprintln!("{seen} seen, {undecided} undecided, {unsupported} unsupported");
    for which in 0..3 {
        let mut one: Vec<f64> = widths.iter().map(|widths| widths[which]).collect();
        one.sort_by(f64::total_cmp);
        eprintln!(
            "{which}: median {} 99 % {} max {}",
            one[one.len() / 2],
            one[one.len() * 99 / 100],
            one[one.len() - 1]
        );
    }
    assert!(undecided == 0 && seen > 300);
}
