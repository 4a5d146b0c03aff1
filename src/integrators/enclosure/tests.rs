use twofloat::TwoFloat;

use super::*;
use crate::exchange::scene_file::shipped;
use crate::integrators::Taylor;
use crate::physics::Scene;
use crate::physics::reference::{self, Exact, ExactState, Source};
use crate::studies::critical_velocity;
use crate::studies::random_problems::Kind;
use crate::studies::relations::{Units, in_units};
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

/// Within a few spacings of V_c the proof is open, also where the margin of its midpoint is zero.
#[test]
fn the_margin_of_an_open_proof_holds_the_exact_one() {
    let slab = Scene::from_toml(shipped("perforate").unwrap(), "perforate").unwrap();
    let mut open = 0;
    for part in 0..24 {
        let thickness = slab.thickness.map(|thickness| thickness * (1.0 + f64::from(part) / 64.0));
        let scene = Scene { thickness, ..slab.clone() };
        let critical = critical_velocity::exact(&scene).unwrap();
        for ulps in -6..=6 {
            let problem = scene.resolve(critical * (1.0 + f64::from(ulps) * f64::EPSILON)).unwrap();
            let flight = Enclosure.solve(&problem, Detail::End).unwrap();
            open += u32::from(flight.outcome == Outcome::Undecided);
            let [margin, bound] = [flight.exit_margin, flight.exit_margin_error].map(Option::unwrap);
            let exact = reference::flight(Source::Problem(&problem)).unwrap().exit_margin.unwrap();
            let error = exact.error_over(margin, &Exact::one());
            assert!(error <= bound, "{margin:e} +- {bound:e} is off by {error:e} at {} m/s", problem.impact_speed);
        }
    }
    assert!(open > 10, "{open} of 312 are open");
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

/// How many problems; `PENETRODE_CASES` asks for more.
fn cases() -> usize {
    std::env::var("PENETRODE_CASES").map_or(20_000, |cases| cases.parse().unwrap())
}

/// What enclosures of many problems came to.
#[derive(Debug, Default)]
struct Seen {
    cases: usize,
    undecided: usize,
    refused: usize,
    /// The greatest error over its bound.
    nearest: f64,
}

impl Seen {
    /// Compares the enclosure of `problem` with double-double, whose 29 digits its balls of 106 bits must hold.
    fn take(&mut self, problem: &Problem) {
        let Ok(exact) = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events) else {
            // Without an end, or beyond the range of numbers: then nothing may be proved but that.
            let ours = Enclosure.enclose(&problem.cast(), Detail::Events);
            assert!(ours.is_err() || ours.is_ok_and(|flight| flight.outcome == Outcome::Undecided), "{problem:?}");
            return;
        };
        self.cases += 1;
        let flight = match Enclosure.enclose(&problem.cast(), Detail::Events) {
            Ok(flight) => flight,
            Err(error) => {
                assert!(matches!(error, IntegrationError::Refused { .. }), "{error} {exact:?} {problem:?}");
                self.refused += 1;
                return;
            }
        };
        if exact.outcome == Outcome::Undecided {
            return;
        }
        if flight.outcome == Outcome::Undecided {
            self.undecided += 1;
            self.compare(problem, &flight.end, &exact.end);
            return;
        }
        assert_eq!(flight.outcome, exact.outcome, "{problem:?}");
        assert_eq!(flight.events.len(), exact.events.len(), "{flight:?} {exact:?} {problem:?}");
        for (event, exact) in flight.events.iter().zip(&exact.events) {
            assert_eq!(event.kind, exact.kind, "{problem:?}");
            self.compare(problem, &event.state, &exact.state);
        }
    }

    fn compare(&mut self, problem: &Problem, ours: &State<Ball>, exact: &State<TwoFloat>) {
        let scale = problem.impact_speed;
        let pairs = [
            (ours.time, exact.time, exact.time.hi()),
            (ours.depth, exact.depth, exact.depth.hi()),
            // Where all but the last digits of the speed are lost, double-double knows it relative to that at impact.
            (ours.velocity, exact.velocity, scale),
        ];
        for (ball, exact, scale) in pairs {
            let slack = 1e-26 * scale.abs();
            let distance = ((exact.hi() - ball.mid.hi) + (exact.lo() - ball.mid.lo)).abs();
            assert!(distance <= ball.radius + slack, "{ours:?} {exact:?} of {problem:?}");
            if distance > slack && ball.radius.is_finite() {
                self.nearest = self.nearest.max((distance - slack) / ball.radius);
            }
        }
    }
}

#[test]
#[ignore = "seconds; .ci/run runs it"]
fn twenty_thousand_enclosures_hold_the_answer_in_double_double() {
    let random = &mut Random::new(99);
    let mut seen = Seen::default();
    while seen.cases < cases() {
        for kind in KINDS {
            if let Some(problem) = kind.draw(random) {
                seen.take(&problem);
            }
        }
    }
    println!("{seen:?}");
    assert!(seen.undecided * 1000 < seen.cases && seen.refused == 0 && seen.nearest > 1e-3 && seen.nearest <= 1.0);
}

/// Speeds next to the critical one, ends of stages at the exit and next to it, stages of no length, stiff and viscous ones, and
/// numbers of any magnitude.
#[test]
#[ignore = "seconds; .ci/run runs it"]
fn twenty_thousand_enclosures_at_the_edges_hold_the_answer_in_double_double() {
    let random = &mut Random::new(4);
    let mut seen = Seen::default();
    while seen.cases < cases() {
        for kind in KINDS {
            let Some(mut problem) = kind.draw(random) else { continue };
            let count = problem.stages.len();
            let next_to = |random: &mut Random, number: f64| {
                number * (1.0 + 10_f64.powf(random.uniform(-16.0, -1.0)) * if random.chance(0.5) { 1.0 } else { -1.0 })
            };
            match random.below(7) {
                0 => {
                    if let Ok(found) = crate::physics::closed_form::critical_of_stages(&problem) {
                        problem.impact_speed = next_to(random, found.velocity);
                    }
                }
                1 => problem.exit_depth = problem.stages[0].end.min(problem.exit_depth),
                2 => problem.exit_depth = next_to(random, problem.stages[0].end.min(1e3)),
                3 if count > 1 => {
                    let index = random.below(count - 1);
                    let stage = problem.stages[index];
                    problem.stages.insert(index, stage);
                    problem.crater = problem.crater.map(|crater| if index <= crater { crater + 1 } else { crater });
                }
                4 => {
                    let index = random.below(count);
                    let stage = &mut problem.stages[index];
                    if stage.stiffness >= 0.0 {
                        stage.stiffness *= random.log_uniform(1e-8, 1e6);
                        stage.viscosity *= random.log_uniform(1e-8, 1e4);
                    }
                }
                5 => {
                    let index = random.below(count);
                    problem.stages[index].static_force *= random.log_uniform(1e-12, 1e3);
                    problem.stages[index].drag *= random.log_uniform(1e-12, 1e3);
                }
                _ => {
                    let [length, mass, time] =
                        [20, 30, 20].map(|far| random.log_uniform(10_f64.powi(-far), 10_f64.powi(far)));
                    problem = in_units(&problem, Units { length, mass, time });
                }
            }
            if problem.exit_depth > 0.0 && problem.impact_speed > 0.0 {
                seen.take(&problem);
            }
        }
    }
    println!("{seen:?}");
    assert!(seen.undecided * 100 < seen.cases && seen.nearest <= 1.0);
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
