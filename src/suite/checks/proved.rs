//! Enclosures: every interval holds the exact answer, and no method decides what an enclosure refutes.

use twofloat::TwoFloat;

use super::super::claim::{Found, Measurement, NotMeasured};
use super::problems::{in_double_double, problems};
use super::{Subject, Worst, worse, worst_of};
use crate::exchange::scene_file::SceneFile;
use crate::integrators::{Detail, Enclosure, Flight};
use crate::physics::ball::Ball;
use crate::physics::reference::{self, Source};
use crate::physics::units::decimal;
use crate::physics::{Advice, Event, EventKind, Outcome, Problem, Scalar, State};
use crate::studies::enclosure;
use crate::studies::random_problems::Kind;
use crate::suite::recorded::{self, RecordedScene};

check! {
    /// `count` random problems of each of `kinds`, enclosed: every event and the end must hold the answer in double-double, and
    /// that in 50 digits where there is one. The width of depth, time and velocity that one in a hundred exceeds; at most one
    /// in a hundred is undecided.
    Encloses {
        /// Kinds of the problems.
        kinds: Vec<Kind>,
        /// How many of each.
        count: usize,
    } in Random, "spacings", by encloses, compares (Enclosure Loop | FiftyDigits);
    /// The scenes with numbers computed elsewhere, from their texts: end and V_c must lie in the enclosures of the decimals as
    /// written. The widest of them.
    EnclosesTexts {} in Random, "spacings", by encloses_texts, compares (Enclosure Loop | Elsewhere);
    /// On `count` random problems of each of `kinds`: how often the method decides another outcome than is proved, or its
    /// margin with its error bound misses the interval of W at the exit.
    Refuted {
        /// Kinds of the problems.
        kinds: Vec<Kind>,
        /// How many of each.
        count: usize,
    } in Random, "refuted", by refuted, compares (MethodItself | Enclosure);
}

/// Width of an interval in spacings of its greater end.
fn spacings((low, high): (f64, f64)) -> f64 {
    let size = low.abs().max(high.abs());
    if low == high { 0.0 } else { (high - low) / (size.next_up() - size) }
}

/// Distance of a number that is known to 29 digits from the middle of `ball`, over its radius: at most one, for radii are far
/// wider than those digits. Infinite where the interval of `f64` does not hold it.
fn share(ball: Ball, exact: TwoFloat) -> f64 {
    let (low, high) = ball.interval();
    let slack = 1e-27 * exact.hi().abs();
    let beyond = |bound: f64| (exact.hi() - bound) + exact.lo();
    if !(beyond(low) >= -slack && beyond(high) <= slack) {
        return f64::INFINITY;
    }
    let distance = ((exact.hi() - ball.mid.hi) + (exact.lo() - ball.mid.lo)).abs();
    if distance <= slack { 0.0 } else { (distance - slack) / ball.radius }
}

/// The greatest [`share`] of a state.
fn share_of(state: &State<Ball>, exact: &State<TwoFloat>) -> f64 {
    let shares =
        [share(state.time, exact.time), share(state.depth, exact.depth), share(state.velocity, exact.velocity)];
    worst_of(shares)
}

/// The enclosure of `problem`.
fn enclosed(problem: &Problem) -> Found<Flight<Ball>> {
    Ok(Enclosure.enclose(&problem.cast(), Detail::Events)?)
}

fn encloses(Encloses { kinds, count }: &Encloses, subject: &Subject<'_>) -> Found {
    let (mut widths, mut undecided, mut all, mut nearest) = (Vec::new(), 0, 0, 0.0);
    for &kind in kinds {
        for (index, problem) in problems(subject, kind, *count)?.iter().enumerate() {
            let flight = enclosed(problem)?;
            let exact = in_double_double(problem)?;
            all += 1;
            let of_end = share_of(&flight.end, &exact.end);
            holds!(of_end <= 1.0, "{:?} is not in {:?}, of {problem:?}", exact.end, flight.end);
            if flight.outcome == Outcome::Undecided {
                undecided += 1;
                continue;
            }
            if exact.outcome != Outcome::Undecided {
                let is_same = flight.outcome == exact.outcome && flight.events.len() == exact.events.len();
                holds!(is_same, "{} where {} is right, of {problem:?}", flight.outcome, exact.outcome);
                for (event, exact) in flight.events.iter().zip(&exact.events) {
                    let share = share_of(&event.state, &exact.state);
                    holds!(event.kind == exact.kind && share <= 1.0, "{exact:?} is not in {event:?}, of {problem:?}");
                    nearest = worse(nearest, share);
                }
            }
            // Stiffness and drag in one stage take 50 digits long.
            if index < 2 && !problem.stages.iter().any(|stage| stage.stiffness > 0.0 && stage.drag > 0.0) {
                in_fifty_digits(problem, &flight)?;
            }
            let State { time, depth, velocity } = flight.end;
            // The velocity is judged by that at impact: at an exit it may be all but lost.
            let speed = problem.impact_speed;
            let of_velocity = (velocity.interval().1 - velocity.interval().0) / (speed.next_up() - speed);
            widths.push(spacings(time.interval()).max(spacings(depth.interval())).max(of_velocity));
        }
    }
    holds!(100 * undecided <= all, "{undecided} of {all} are undecided");
    // A bound that no answer comes near says that its derivation gives too much away.
    holds!(nearest >= 1e-3, "errors come to {nearest:.0e} of their bounds only");
    widths.sort_by(f64::total_cmp);
    let [middle, high] = [50, 99].map(|percent| widths.get(widths.len() * percent / 100).copied().unwrap_or(f64::NAN));
    let widest = widths.last().copied().unwrap_or(f64::NAN);
    let remark = format!(
        "half of {all} are no wider than {middle:.1}, all than {widest:.1}; {undecided} undecided; errors come to {nearest:.2} of \
         their bounds"
    );
    Ok(Measurement::new(high).remark(remark).cases(all))
}

/// Compares with the reference of 50 digits, where that has stages of this kind.
fn in_fifty_digits(problem: &Problem, flight: &Flight<Ball>) -> Found<()> {
    let Ok(exact) = reference::flight(Source::Problem(problem)) else { return Ok(()) };
    for (Event { kind, state }, exact) in flight.events.iter().zip(&exact.events) {
        let pairs = [
            (state.time, &exact.state.time),
            (state.depth, &exact.state.depth),
            (state.velocity, &exact.state.velocity),
        ];
        let is_held = pairs.iter().all(|(ball, exact)| exact.lies_between(ball.interval()));
        holds!(is_held, "{kind:?} in 50 digits is not in {state:?}, of {problem:?}");
    }
    Ok(())
}

fn encloses_texts(_subject: &Subject<'_>) -> Found {
    let mut worst = Worst::default();
    let mut compared = 0;
    for scene in recorded::scenes().map_err(NotMeasured::broken)? {
        let name = &scene.name;
        let read = match &scene.text {
            Some(text) => SceneFile::from_toml(text, name, &[]),
            None => SceneFile::read(std::path::Path::new(name), &[]),
        };
        let unread = |error| NotMeasured::broken(format!("`{name}` cannot be read: {error}"));
        let SceneFile { scene: read, written } = read.map_err(unread)?;
        let mut meets = |path: &str, interval: (f64, f64), ball: Option<Ball>| -> Found<()> {
            let Some(exact) = number(scene, path) else { return Ok(()) };
            let is_met = exact.upper() >= interval.0 && exact.lower() <= interval.1;
            // Beside `f64`, which has 16: the ball has 31 digits, and the number 19.
            let is_near = |ball: Ball| (ball - exact).value().abs() <= ball.radius + exact.radius;
            let is_held = is_met && ball.is_none_or(is_near);
            holds!(is_held, "{path} of `{name}` is not between {} and {}", interval.0, interval.1);
            compared += 1;
            if interval.0 > 0.0 {
                worst.take(spacings(interval), || format!("{path} of `{name}`"));
            }
            Ok(())
        };
        if read.velocity.is_some() {
            match enclosure::flight(&read, &written, Detail::Events)? {
                // Open is what no proof excludes, and says nothing.
                Ok(flight) if flight.outcome == Outcome::Undecided => {}
                Ok(flight) => {
                    let State { time, depth, velocity } = flight.end;
                    for (path, ball) in [("time_s", time), ("depth_m", depth), ("velocity_m_s", velocity)] {
                        meets(path, ball.interval(), Some(ball))?;
                    }
                }
                Err(error) if error.is_usage() => continue,
                Err(error) => return Err(error.into()),
            }
        }
        if number(scene, "critical_velocity_m_s").is_some()
            && let Some(interval) = enclosure::critical(&read, &written)
        {
            meets("critical_velocity_m_s", interval, None)?;
        }
    }
    holds!(compared >= 60, "only {compared} numbers were compared");
    let found = worst.measurement();
    let remark = format!("{compared} numbers; {}", found.remark);
    Ok(found.remark(remark).cases(compared))
}

/// The number at `path` as recorded, with 19 digits at least: half a unit of the last is its error.
fn number(scene: &RecordedScene, path: &str) -> Option<Ball> {
    let (digits, exponent) = decimal(scene.numbers.get(path)?)?;
    let exact = Ball::of_decimal(digits, exponent);
    Some(exact.widened(5e-19 * exact.magnitude()))
}

fn refuted(Refuted { kinds, count }: &Refuted, subject: &Subject<'_>) -> Found {
    let method = subject.method(None)?;
    let (mut refuted, mut compared) = (0, 0);
    let mut first = String::new();
    for &kind in kinds {
        for problem in problems(subject, kind, *count)? {
            let proved = enclosed(&problem)?;
            let flight = match method.integrator().solve(&problem, Detail::Events) {
                Ok(flight) => flight,
                Err(error) if error.is_usage() => continue,
                Err(error) => return Err(error.into()),
            };
            if [proved.outcome, flight.outcome].contains(&Outcome::Undecided) {
                continue;
            }
            compared += 1;
            let agrees = flight.outcome == proved.outcome && margin_meets(&problem, &flight, &proved);
            if !agrees {
                refuted += 1;
                if first.is_empty() {
                    first =
                        format!("; the first: {} where {} is proved, of {problem:?}", flight.outcome, proved.outcome);
                }
            }
        }
    }
    Ok(Measurement::count(refuted).remark(format!("{compared} compared{first}")).cases(compared))
}

/// Whether the margin of `flight`, give or take its error bound, meets W at the exit, where that is the margin.
fn margin_meets(problem: &Problem, flight: &Flight, proved: &Flight<Ball>) -> bool {
    let Some((margin, error)) = flight.exit_margin.zip(flight.exit_margin_error) else { return true };
    if !proved.events.iter().any(|event| event.kind == EventKind::Exit) {
        return true;
    }
    let least = |end: fn(Ball) -> f64| {
        let passed = proved.events.iter().filter(|event| event.kind != EventKind::Rest);
        passed.map(|event| end(event.state.velocity)).fold(f64::INFINITY, f64::min)
    };
    let square = |speed: f64| speed / problem.impact_speed * (speed / problem.impact_speed);
    let (low, high) = (square(least(Ball::lower).max(0.0)), square(least(Ball::upper)));
    // Four roundings of the squares here.
    margin - error <= high * (1.0 + 4.0 * f64::EPSILON) && margin + error >= low * (1.0 - 4.0 * f64::EPSILON)
}
