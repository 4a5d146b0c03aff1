//! Enclosures: every interval holds the exact answer, and no method decides what an enclosure refutes.

use twofloat::TwoFloat;

use super::super::claim::{Found, Measurement, NotMeasured};
use super::problems::{in_double_double, problems};
use super::{Subject, Worst, worse, worst_of};
use crate::exchange::scene_file::SceneFile;
use crate::integrators::method::MethodName;
use crate::integrators::{ClosedForm, Detail, Enclosure, Flight, Integrator};
use crate::physics::ball::Ball;
use crate::physics::decimals::Written;
use crate::physics::reference::{self, Source};
use crate::physics::units::decimal;
use crate::physics::{
    Advice, Concrete, CraterStiffness, Event, EventKind, Outcome, Parameter, Problem, Scalar, Scene, State,
};
use crate::studies::boxes::{Outcomes, Region, Side};
use crate::studies::random::Random;
use crate::studies::random_problems::Kind;
use crate::studies::random_scenes::Generator;
use crate::studies::{critical_velocity, enclosure};
use crate::suite::recorded::{self, EnclosedEvent, EnclosedScene, Prover, RecordedScene};

check! {
    /// `count` random problems of each of `kinds`, enclosed: every event and the end must hold the answer in double-double, and
    /// that in 50 digits where there is one. The width of depth, time and velocity that one in a hundred exceeds; at most one
    /// in a hundred is undecided.
    Encloses {
        /// Kinds of the problems.
        #[serde(deserialize_with = "crate::suite::checks::some")]
        kinds: Vec<Kind>,
        /// How many of each.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
    } in Random, "spacings", by encloses, compares (Enclosure Loop | FiftyDigits);
    /// The scenes with numbers computed elsewhere, from their texts: end and V_c must lie in the enclosures of the decimals as
    /// written. The widest of them.
    EnclosesTexts {} in Random, "spacings", by encloses_texts, compares (Enclosure Loop | Elsewhere);
    /// Scenes of which another program proves its answers, from their texts: numbers of which the enclosure and that of the
    /// program have nothing in common. Of another method: outcomes that are refuted, and margins that with their error bounds
    /// miss the program's W at the exit.
    SecondOpinion {
        /// The program.
        prover: Prover,
    } in Random, "refuted", by second_opinion, compares (Method | Elsewhere);
    /// On `count` random problems of each of `kinds`: how often the method decides another outcome than is proved, or its
    /// margin with its error bound misses the interval of W at the exit.
    Refuted {
        /// Kinds of the problems.
        #[serde(deserialize_with = "crate::suite::checks::some")]
        kinds: Vec<Kind>,
        /// How many of each.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
    } in Random, "refuted", by refuted, compares (MethodItself | Enclosure);
    /// The same on random laws `P exp(-V/v1)`, which fall so steeply that an error of the energy grows by up to e^12; and the depths
    /// of rest, `M v1²/P ((u - 1) exp(u) + 1)` with u = V0/v1, that are not reached.
    RefutedLaws {
        /// How many.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        laws: usize,
    } in Random, "refuted", by refuted_laws, compares (MethodItself | Enclosure);
    /// Random boxes around random scenes, half of them where the crater's share of the energy changes what more drag does:
    /// points of the box, corners among them, whose end or V_c by the closed form lies outside of what is proved of the box.
    /// All narrow boxes must have a proof, and one of the wide ones around a change.
    Boxes {
        /// How many.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        boxes: usize,
    } in Random, "points outside", by boxes, compares (Enclosure | ClosedForm);
}

/// A box around a scene: its mass and another of its numbers.
fn random_box(generator: &mut Generator, random: &mut Random, is_near_change: bool) -> (Scene, Vec<Side>) {
    let mut scene = generator.next_scene();
    if let (true, Some(concrete)) = (is_near_change, scene.concrete()) {
        // M V0² = k d P, with Q of the size of M/(k d).
        let mut concrete = Concrete { crater_stiffness: CraterStiffness::Continuous, ..concrete.clone() };
        let area = std::f64::consts::FRAC_PI_4 * concrete.diameter.powi(2);
        let depth = concrete.crater_ratio * concrete.diameter;
        concrete.density = random.uniform(0.3, 3.0) * scene.mass / (depth * area * concrete.nose_factor);
        let force = area * concrete.static_factor * concrete.strength;
        let velocity = (random.uniform(0.6, 1.7) * depth * force / scene.mass).sqrt();
        let thickness = Some(depth * random.uniform(0.3, 1.6));
        scene = Scene { velocity: Some(velocity), thickness, ..Scene::of_concrete(scene.mass, concrete) };
    }
    let width = if is_near_change { 0.4 } else { 0.1 };
    let known = [
        Parameter::Mass,
        Parameter::Density,
        Parameter::NoseFactor,
        Parameter::Strength,
        Parameter::Velocity,
        Parameter::Thickness,
    ];
    let mut sides: Vec<Side> = Vec::new();
    // Mass and drag are what the change depends on.
    let asked = [0, if is_near_change { 1 + random.below(2) } else { random.below(known.len()) }];
    for (parameter, value) in asked.map(|index| known[index]).map(|parameter| (parameter, parameter.get(&scene))) {
        let Ok(value) = value else { continue };
        let high = value * (1.0 + width);
        let high = if parameter == Parameter::NoseFactor { high.min(1.0) } else { high };
        if value > 0.0 && value.is_finite() && sides.iter().all(|side| side.parameter != parameter) {
            sides.push(Side { parameter, low: value * (1.0 - width), high, unit: None });
        }
    }
    (scene, sides)
}

fn boxes(&Boxes { boxes }: &Boxes, subject: &Subject<'_>) -> Found {
    const POINTS: usize = 24;
    let mut random = subject.random("boxes");
    let mut generator = Generator::new(subject.context.seed, "boxes");
    let (mut asked, mut proved, mut points, mut outside, mut first) = ([0; 2], [0; 2], 0, 0, String::new());
    let written = Written::default();
    for index in 0..boxes {
        let (scene, sides) = random_box(&mut generator, &mut random, index % 2 == 0);
        let Ok(region) = Region::new(&scene, &written, &sides) else { continue };
        asked[index % 2] += 1;
        let (found, critical) = (region.flight()?, if index % 4 < 2 { region.critical() } else { None });
        proved[index % 2] += usize::from(found.is_some());
        for point in 0..POINTS {
            let mut at = scene.clone();
            for (place, side) in sides.iter().enumerate() {
                // The corners first.
                let share = if point < 4 { f64::from((point >> place & 1) as u32) } else { random.unit() };
                side.parameter.set(&mut at, side.low + share * (side.high - side.low))?;
            }
            let holds = |(low, high): (Option<f64>, Option<f64>), exact: f64| {
                low.is_none_or(|low| exact >= low * (1.0 - 1e-9) - 1e-300)
                    && high.is_none_or(|high| exact <= high * (1.0 + 1e-9))
            };
            let mut see = |holds: bool, what: String| {
                points += 1;
                if !holds {
                    outside += 1;
                    if first.is_empty() {
                        first = format!("{what}, of {sides:?} around {scene:?}");
                    }
                }
            };
            if let (Some(ranges), Ok(flight)) = (&found, ClosedForm.solve(&at.problem()?, Detail::End)) {
                let is_near = flight.outcome == Outcome::Undecided;
                let is_right = match ranges.outcomes {
                    // To rest in the crater or behind it is one to a box that holds both.
                    Outcomes::One(outcome) => flight.outcome.is_stop() == outcome.is_stop(),
                    Outcomes::Either => true,
                };
                see(is_near || is_right, format!("{} and not {:?}", flight.outcome, ranges.outcomes));
                let end = flight.end;
                see(is_near || holds(ranges.end.depth_m, end.depth), format!("ends at {} m", end.depth));
                see(is_near || holds(ranges.end.time_s, end.time), format!("ends at {} s", end.time));
                let velocity = ranges.end.velocity_m_s;
                see(is_near || holds(velocity, end.velocity), format!("ends with {} m/s", end.velocity));
            }
            if let (Some((low, high)), Ok(exact)) = (critical, critical_velocity::of_scene(&at, &ClosedForm)) {
                see(holds((Some(low), Some(high)), exact.velocity), format!("V_c = {} m/s", exact.velocity));
            }
        }
    }
    // Of the wide ones five in six have a proof, and under one seed of two hundred one of four.
    let ([wide, narrow], [asked_wide, asked_narrow]) = (proved, asked);
    let of = format!("{wide} of {asked_wide} wide boxes and {narrow} of {asked_narrow} narrow ones");
    holds!(narrow == asked_narrow && (wide > 0 || asked_wide == 0), "{of} have a proof");
    let remark = if outside == 0 { format!("{of} proved") } else { first };
    Ok(Measurement::count(outside).remark(remark).cases(points))
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

/// The scene of a record: its text, or the shipped file.
fn file(name: &str, text: Option<&str>) -> Found<SceneFile> {
    let read = match text {
        Some(text) => SceneFile::from_toml(text, name, &[]),
        None => SceneFile::read(std::path::Path::new(name), &[]),
    };
    read.map_err(|error| NotMeasured::broken(format!("`{name}` cannot be read: {error}")))
}

fn encloses_texts(_subject: &Subject<'_>) -> Found {
    let mut worst = Worst::default();
    let mut compared = 0;
    for scene in recorded::scenes().map_err(NotMeasured::broken)? {
        let name = &scene.name;
        let SceneFile { scene: read, written } = file(name, scene.text.as_deref())?;
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

/// What of a method is refuted.
#[derive(Default)]
struct Refutations {
    refuted: usize,
    compared: usize,
    first: String,
}

impl Refutations {
    fn look(&mut self, method: &dyn Integrator, problem: &Problem) -> Found<()> {
        let proved = enclosed(problem)?;
        let flight = match method.solve(problem, Detail::Events) {
            Ok(flight) => flight,
            Err(error) if error.is_usage() => return Ok(()),
            Err(error) => return Err(error.into()),
        };
        if [proved.outcome, flight.outcome].contains(&Outcome::Undecided) {
            return Ok(());
        }
        self.compared += 1;
        let passed = || {
            let passed = proved.events.iter().filter(|event| event.kind != EventKind::Rest);
            passed.map(|event| (event.state.velocity.lower(), event.state.velocity.upper()))
        };
        let perforates = proved.events.iter().any(|event| event.kind == EventKind::Exit);
        // Four roundings of the squares.
        let agrees = flight.outcome == proved.outcome && (!perforates || margin_meets(problem, &flight, passed(), 4.0));
        self.expect(agrees, || format!("{} where {} is proved, of {problem:?}", flight.outcome, proved.outcome));
        Ok(())
    }

    fn expect(&mut self, holds: bool, why: impl FnOnce() -> String) {
        self.refuted += usize::from(!holds);
        if !holds && self.first.is_empty() {
            self.first = format!("; the first: {}", why());
        }
    }

    fn measurement(self) -> Measurement {
        let Self { refuted, compared, first } = self;
        Measurement::count(refuted).remark(format!("{compared} compared{first}")).cases(compared)
    }
}

fn refuted(Refuted { kinds, count }: &Refuted, subject: &Subject<'_>) -> Found {
    let method = subject.method(None)?;
    let mut seen = Refutations::default();
    for &kind in kinds {
        for problem in problems(subject, kind, *count)? {
            seen.look(method.integrator(), &problem)?;
        }
    }
    Ok(seen.measurement())
}

/// Promises of a method by which depths of rest under such laws may be off: their condition is 13 at most.
const FALLING_MAX: f64 = 100.0;

fn refuted_laws(&RefutedLaws { laws }: &RefutedLaws, subject: &Subject<'_>) -> Found {
    let method = subject.method(None)?;
    let mut random = subject.random("falling laws");
    let mut seen = Refutations::default();
    for _ in 0..laws {
        let (mass, speed) = (random.uniform(0.5, 5.0), random.uniform(100.0, 400.0));
        let (steepness, left) = (random.uniform(2.0, 12.0), random.log_uniform(0.02, 0.6));
        let (force, v1) = (random.log_uniform(1e4, 1e6) * steepness.exp(), speed / steepness);
        // The distance from V0 to V, u = V/v1: M v1²/P times the difference of (u - 1) exp(u).
        let distance = |u: f64| {
            let antiderivative = |u: f64| (u - 1.0) * u.exp();
            mass * v1 * v1 / force * (antiderivative(steepness) - antiderivative(u))
        };
        let leaves = random.chance(0.7);
        let exit = if leaves { distance(left * steepness) } else { 2.0 * distance(0.0) };
        let text = format!(
            "projectile.mass = {mass:?}\nimpact.velocity = {speed:?}\ntarget.thickness = {exit:?}\n[parameters]\n\
             P = \"{force:?} N\"\nv1 = \"{v1:?} m/s\"\n[[stage]]\nforce = \"P*exp(-V/v1)\"\n"
        );
        let scene = Scene::from_toml(&text, "a falling law").map_err(|error| NotMeasured::broken(error.to_string()))?;
        let problem = scene.problem()?;
        seen.look(method.integrator(), &problem)?;
        if !leaves {
            let end = subject.flight(&problem)?.end;
            let error = (end.depth / distance(0.0) - 1.0).abs();
            seen.expect(error <= FALLING_MAX * subject.promise(), || format!("depth off by {error:e}, {text}"));
        }
    }
    holds!(2 * seen.compared > laws, "{} of {laws} laws are compared", seen.compared);
    Ok(seen.measurement())
}

/// Whether the margin of `flight`, which leaves the target, give or take its error bound and some `roundings`, meets the least W
/// of the events that are passed, whose velocities lie between two numbers each.
fn margin_meets(problem: &Problem, flight: &Flight, passed: impl Iterator<Item = (f64, f64)>, roundings: f64) -> bool {
    let Some((margin, error)) = flight.exit_margin.zip(flight.exit_margin_error) else { return true };
    let (low, high) =
        passed.fold((f64::INFINITY, f64::INFINITY), |least, one| (least.0.min(one.0), least.1.min(one.1)));
    let square = |speed: f64| speed / problem.impact_speed * (speed / problem.impact_speed);
    let slack = roundings * f64::EPSILON;
    margin - error <= square(high) * (1.0 + slack) && margin + error >= square(low.max(0.0)) * (1.0 - slack)
}

/// An interval of a record: the balls of its two decimals.
fn recorded_interval([low, high]: &[String; 2]) -> Found<(Ball, Ball)> {
    let ball = |text: &str| decimal(text).map(|(digits, exponent)| Ball::of_decimal(digits, exponent));
    ball(low).zip(ball(high)).ok_or_else(|| NotMeasured::broken(format!("[{low}, {high}] is no interval")))
}

/// Whether a number may lie both in `ball` and between `low` and `high`.
fn meets(ball: Ball, (low, high): (Ball, Ball)) -> bool {
    (low - ball).lower() <= 0.0 && (ball - high).lower() <= 0.0
}

/// The quantities of an event of ours beside those of the record.
fn pairs<'a>(state: &State<Ball>, event: &'a EnclosedEvent) -> [(&'static str, Ball, &'a [String; 2]); 3] {
    [
        ("time", state.time, &event.time_s),
        ("depth", state.depth, &event.depth_m),
        ("velocity", state.velocity, &event.velocity_m_s),
    ]
}

fn second_opinion(&SecondOpinion { prover }: &SecondOpinion, subject: &Subject<'_>) -> Found {
    let opinion = recorded::opinion(prover).map_err(NotMeasured::broken)?;
    let (mut refuted, mut compared, mut scenes, mut first) = (0, 0, 0, String::new());
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let mut see = |agrees: bool, what: String| {
        compared += 1;
        if !agrees {
            refuted += 1;
            if first.is_empty() {
                first = format!("; the first: {what}");
            }
        }
    };
    for scene in &opinion.scenes {
        let EnclosedScene { name, text, outcome, events, refused } = scene;
        let SceneFile { scene: read, written } = file(name, text.as_deref())?;
        let is_outcome = |found: Outcome| found.is_stop() == (outcome == "stopped");
        if subject.method_name() != MethodName::Enclosure {
            let problem = read.problem()?;
            let flight = match subject.method(None)?.integrator().solve(&problem, Detail::Events) {
                Ok(flight) => flight,
                Err(error) if error.is_usage() => continue,
                Err(error) => return Err(error.into()),
            };
            if flight.outcome == Outcome::Undecided || outcome == "undecided" {
                continue;
            }
            scenes += 1;
            see(is_outcome(flight.outcome), format!("{name} is {outcome} and not {}", flight.outcome));
            if outcome == "perforated" && refused.is_none() {
                let mut passed = Vec::new();
                for event in events {
                    let (low, high) = recorded_interval(&event.velocity_m_s)?;
                    passed.push((low.lower(), high.upper()));
                }
                // Force, drag and c of a scene that ships are rounded to `f64`, which the bound does not cover.
                let roundings = if text.is_some() { 4.0 } else { 32.0 };
                let agrees = margin_meets(&problem, &flight, passed.into_iter(), roundings);
                see(agrees, format!("the margin {:?} of {name}", flight.exit_margin));
            }
            continue;
        }
        let flight = match enclosure::flight(&read, &written, Detail::Events)? {
            Ok(flight) => flight,
            Err(error) if error.is_usage() => continue,
            Err(error) => return Err(error.into()),
        };
        if flight.outcome == Outcome::Undecided {
            continue;
        }
        scenes += 1;
        if outcome != "undecided" {
            see(is_outcome(flight.outcome), format!("{name} is {outcome} and not {}", flight.outcome));
        }
        let is_whole = refused.is_some() || events.len() == flight.events.len();
        holds!(is_whole && events.len() <= flight.events.len(), "`{name}` has {} events", flight.events.len());
        for (event, recorded) in flight.events.iter().zip(events) {
            let kind = event.kind.name();
            holds!(kind == recorded.event, "{kind} of `{name}` is {} in the record", recorded.event);
            for (quantity, ball, interval) in pairs(&event.state, recorded) {
                let (low, high) = recorded_interval(interval)?;
                see(meets(ball, (low, high)), format!("{quantity} of {kind} of {name}: {ball:?}, {interval:?}"));
                if ball.radius > 0.0 {
                    ours.push(spacings(ball.interval()));
                    theirs.push(spacings((low.lower(), high.upper())));
                }
            }
        }
    }
    holds!(scenes >= 20, "only {scenes} scenes were compared");
    let middle = |mut widths: Vec<f64>| {
        widths.sort_by(f64::total_cmp);
        widths.get(widths.len() / 2).copied()
    };
    let widths = middle(ours).zip(middle(theirs)).map_or_else(String::new, |(ours, theirs)| {
        format!("; half of ours are no wider than {ours:.1} spacings, of theirs than {theirs:.1}")
    });
    let remark = format!("{compared} numbers of {scenes} scenes, {}{widths}{first}", opinion.program);
    Ok(Measurement::count(refuted).remark(remark).cases(compared))
}
