//! Random problems of every kind of stage: every number of a solution, every error bound, every tolerance.
//!
//! Truth is the Taylor series in double-double, whose event states are compared with 50 digits on some of the problems.

use twofloat::TwoFloat;

use super::super::claim::{Found, Measurement, NotMeasured};
use super::edges::is_right;
use super::{Subject, Worst, refusal_or_failure, worse, worst_of};
use crate::integrators::{Detail, Energy, Flight, Method, Taylor};
use crate::physics::reference::{self, Exact, Source};
use crate::physics::{Advice, Event, EventKind, Outcome, Problem, Scalar, State};
use crate::studies::critical_velocity::critical_velocity;
use crate::studies::random_problems::Kind;
use crate::studies::rounding;

check! {
    /// `count` random problems of each of `kinds`, solved by the method: outcome, every event, rows of the path (depth, time,
    /// velocity, force and stage) and the end against double-double; worst error over its condition.
    EveryNumber {
        /// Kinds of the problems.
        #[serde(deserialize_with = "crate::suite::checks::some")]
        kinds: Vec<Kind>,
        /// How many of each.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
        /// Relative tolerance of the method.
        rtol: Option<f64>,
    } in Random, "promises x condition", by every_number, compares (Method | FiftyDigits);
    /// Error bounds of the exit margin of `count` random problems of each of `kinds`: how many times the bound holds the
    /// error that a tenth of the problems of a kind exceed, of the kind where it is most. An error beyond its bound breaks
    /// it, and so does a kind below `least`.
    MarginBound {
        /// Kinds of the problems.
        #[serde(deserialize_with = "crate::suite::checks::some")]
        kinds: Vec<Kind>,
        /// How many of each.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
        /// The least quotient of bound and error.
        #[serde(deserialize_with = "crate::suite::checks::positive")]
        least: f64,
        /// Relative tolerance of the method.
        rtol: Option<f64>,
    } in Random, "bound/error", by margin_bound, compares (Method | FiftyDigits);
    /// The same of the critical velocity, found by halving in double-double.
    CriticalBound {
        /// Kinds of the problems.
        #[serde(deserialize_with = "crate::suite::checks::some")]
        kinds: Vec<Kind>,
        /// How many of each.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
        /// The least quotient of bound and error.
        #[serde(deserialize_with = "crate::suite::checks::positive")]
        least: f64,
        /// Relative tolerance of the method.
        rtol: Option<f64>,
    } in Random, "bound/error", by critical_bound, compares (Method Search | FiftyDigits);
    /// Mean error over random problems against the tolerance, from `from` to `to`: distance of the slope from `slope`. A
    /// cost that does not rise breaks it, and so does an error at `to` that is not within a factor 10 of `level` tolerances.
    Response {
        /// Largest tolerance.
        from: f64,
        /// Smallest tolerance.
        to: f64,
        /// Slope expected.
        slope: f64,
        /// Error at `to` over `to`.
        level: f64,
        /// How many problems.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        count: usize,
    } in Random, "order", by response, compares (Method | FiftyDigits);
}

/// `count` problems of `kind` for the claim.
pub(super) fn problems(subject: &Subject<'_>, kind: Kind, count: usize) -> Found<Vec<Problem>> {
    let mut random = subject.random(&format!("problems {kind:?}"));
    let drawn: Vec<_> = (0..2 * count).filter_map(|_| kind.draw(&mut random)).take(count).collect();
    holds!(drawn.len() == count, "only {} of {} problems come to rest", drawn.len(), 2 * count);
    Ok(drawn)
}

/// The solution, unless the method has none for stages of this kind.
fn attempt(method: &Method, problem: &Problem, detail: Detail) -> Found<Option<Flight>> {
    match method.integrator().solve(problem, detail) {
        Ok(flight) => Ok(Some(flight)),
        Err(error) if error.is_usage() => Ok(None),
        Err(error) => Err(refusal_or_failure(error)),
    }
}

/// The solution in double-double.
pub(super) fn in_double_double(problem: &Problem) -> Found<Flight<TwoFloat>> {
    Ok(Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events)?)
}

/// Compares `exact` with the reference of 50 digits, where that has stages of this kind.
fn confirm(problem: &Problem, exact: &Flight<TwoFloat>) -> Found<()> {
    let Ok(reference) = reference::flight(Source::Problem(problem)) else { return Ok(()) };
    let pairs = exact.events.iter().zip(&reference.events);
    let is_same = exact.events.len() == reference.events.len()
        && pairs.clone().all(|(event, reference)| event.kind == reference.kind);
    holds!(is_same, "{exact:?} in double-double, {reference:?} in 50 digits, of {problem:?}");
    for (event, reference) in pairs {
        let State { time, depth, velocity } = event.state;
        let exact_state = &reference.state;
        let off = worst_of([
            exact_state.time.relative_error(time.hi()) * f64::from(u8::from(time.hi() != 0.0)),
            exact_state.depth.relative_error(depth.hi()),
            exact_state.velocity.error_over(velocity.hi(), &Exact::one()) / problem.impact_speed,
        ]);
        holds!(off <= f64::EPSILON, "{event:?} is off by {off:e} in 50 digits, of {problem:?}");
    }
    Ok(())
}

/// How errors of a path are judged: by what an error of the energy, relative to its greatest value, makes of each number.
struct Judge<'a> {
    problem: &'a Problem,
    /// The greatest speed at impact or an event.
    fastest: f64,
    /// Time and speed at impact and at each event.
    passed: Vec<(f64, f64)>,
}

impl<'a> Judge<'a> {
    fn new(problem: &'a Problem, exact: &Flight<TwoFloat>) -> Self {
        let events = exact.events.iter().map(|event| (event.state.time.value(), event.state.velocity.value()));
        let passed: Vec<_> = std::iter::once((0.0, problem.impact_speed)).chain(events).collect();
        let fastest = passed.iter().fold(0.0, |most: f64, (_, speed)| most.max(*speed));
        Self { problem, fastest, passed }
    }

    /// By how much an error `e` of the energy, over the greatest one, moves the time: by `e` times this, as the sum of
    /// `fastest² Δt / (2 V_1 V_2)` between neighbouring events, which is exact under a constant force.
    fn lateness(&self, time: f64, velocity: f64) -> f64 {
        let before = self.passed.iter().copied().filter(|(passed, _)| *passed < time);
        let path: Vec<_> = before.chain([(time, velocity)]).collect();
        let late = |pair: &[(f64, f64)]| (pair[1].0 - pair[0].0) / (2.0 * pair[0].1 * pair[1].1);
        self.fastest * self.fastest * path.windows(2).map(late).sum::<f64>()
    }

    /// Worst error of `found`, at a boundary or inside a stage, against `exact` at the same depth.
    fn passing(&self, found: &State, exact: &State<TwoFloat>) -> f64 {
        let (time, depth, velocity) = (exact.time.value(), exact.depth.value(), exact.velocity.value());
        if time == 0.0 || depth == 0.0 {
            return if found.time == 0.0 { 0.0 } else { f64::INFINITY };
        }
        let (v, t) = (TwoFloat::from(found.velocity), TwoFloat::from(found.time));
        let energy = ((v - exact.velocity) * (v + exact.velocity)).value() / self.fastest / self.fastest;
        let late = (t - exact.time).value() / self.lateness(time, velocity).max(time);
        worse(energy.abs(), late.abs())
    }

    /// Worst error of `found` at rest, in `stage`.
    fn at_rest(&self, found: &State, exact: &State<TwoFloat>, stage: usize) -> f64 {
        let (time, depth) = (exact.time.value(), exact.depth.value());
        let brake = self.problem.stages[stage].force(depth, 0.0) / self.problem.mass;
        let far = (TwoFloat::from(found.depth) - exact.depth).value() / depth;
        let late = (TwoFloat::from(found.time) - exact.time).value();
        let in_depth = (2.0 * brake * depth / self.fastest / self.fastest).min(1.0);
        // Rest lies behind the other events, and its own speed is none.
        let before = self.passed.iter().copied().rfind(|(passed, speed)| *passed < time && *speed > 0.0);
        let (passed, speed) = before.unwrap_or((0.0, self.fastest));
        let lateness = self.lateness(passed, speed) + self.fastest * self.fastest / (2.0 * speed * brake);
        let late = late / lateness.max(time);
        if found.velocity == 0.0 { worse((far * in_depth).abs(), late.abs()) } else { f64::NAN }
    }
}

/// Worst error of the events and of the end of `flight`; what is missing, or in another order, breaks the claim.
fn error_of_events(problem: &Problem, flight: &Flight, exact: &Flight<TwoFloat>) -> Found<f64> {
    let kinds = |events: &[EventKind]| format!("{events:?}");
    let found: Vec<_> = flight.events.iter().map(|event| event.kind).collect();
    let right: Vec<_> = exact.events.iter().map(|event| event.kind).collect();
    holds!(found == right, "{} in place of {}, of {problem:?}", kinds(&found), kinds(&right));
    holds!(flight.stage == exact.stage, "ends in stage {}, not {}, of {problem:?}", flight.stage, exact.stage);
    let last = flight.events.last().map(|event| event.state);
    holds!(last == Some(flight.end), "the last event is not the end of {problem:?}");
    let judge = Judge::new(problem, exact);
    let mut worst = 0.0;
    for (event, Event { kind, state }) in flight.events.iter().zip(&exact.events) {
        let error = if *kind == EventKind::Rest {
            judge.at_rest(&event.state, state, exact.stage)
        } else {
            holds!(event.state.depth == state.depth.value(), "{kind:?} at {} m of {problem:?}", event.state.depth);
            judge.passing(&event.state, state)
        };
        worst = worse(worst, error);
    }
    Ok(worst)
}

/// Worst error of four rows of the path of `flight` or more; its force is the law of its stage in every row.
fn error_of_rows(problem: &Problem, flight: &Flight, exact_end: &Flight<TwoFloat>) -> Found<f64> {
    let rows = &flight.trajectory;
    let (first, last) = rows.first().zip(rows.last()).ok_or_else(|| NotMeasured::broken("no path"))?;
    holds!(first.state == State::at_impact(problem), "the path begins at {}", first.state);
    holds!(last.state == flight.end, "the path ends at {}, the flight at {}", last.state, flight.end);
    holds!(rows.windows(2).all(|pair| pair[0].state.time <= pair[1].state.time), "times fall in {problem:?}");
    let mut worst = 0.0;
    let judge = Judge::new(problem, exact_end);
    let apart = (rows.len() / 4).max(2);
    for (index, row) in rows.iter().enumerate() {
        let State { depth: x, velocity: v, .. } = row.state;
        let law = &problem.stages[row.stage];
        let is_inside = problem.start_of(row.stage) <= x && x <= law.end;
        holds!(is_inside, "a row at {x} m is of stage {} of {problem:?}", row.stage);
        let terms = [law.static_force, law.stiffness * x, law.viscosity * v, law.drag * v * v];
        let size: f64 = terms.iter().map(|term| term.abs()).sum();
        let difference = (row.force - terms.iter().sum::<f64>()).abs();
        holds!(difference <= 8.0 * f64::EPSILON * size, "force {} N at {} of {problem:?}", row.force, row.state);
        let is_judged = index % apart == apart - 1 && x > 0.0 && v > 0.0 && x < exact_end.end.depth.value();
        if is_judged {
            let there = in_double_double(&problem.clone().with_exit(x))?;
            worst = worse(worst, judge.passing(&row.state, &there.end));
        }
    }
    Ok(worst)
}

fn every_number(EveryNumber { kinds, count, rtol }: &EveryNumber, subject: &Subject<'_>) -> Found {
    let method = subject.method(*rtol)?;
    let promise = rtol.map_or(subject.promise(), |rtol| subject.method_name().promise_at(rtol));
    let mut worst = Worst::default();
    let mut solved = 0;
    for &kind in kinds {
        let (mut judged, mut stops) = (0, 0);
        // Of a dozen none may stop, or all, by chance: then more are drawn.
        let has_both = |judged: usize, stops: usize| (judged / 12..=judged - judged / 12).contains(&stops);
        for (index, problem) in problems(subject, kind, 3 * *count)?.iter().enumerate() {
            if index >= *count && has_both(judged, stops) {
                break;
            }
            let Some(flight) = attempt(&method, problem, Detail::Trajectory)? else { continue };
            let exact = in_double_double(problem)?;
            if let Some(margin) = exact_margin(problem, &exact)? {
                holds!(is_right(flight.outcome, margin.value()), "{} of {problem:?}", flight.outcome);
            }
            judged += 1;
            // Stiffness and drag in one stage take 50 digits long; the other methods stand for them.
            if index < 2 && !problem.stages.iter().any(|stage| stage.stiffness > 0.0 && stage.drag > 0.0) {
                confirm(problem, &exact)?;
            }
            if [flight.outcome, exact.outcome].contains(&Outcome::Undecided) {
                continue;
            }
            let is_same = flight.outcome == exact.outcome;
            holds!(is_same, "{} where {} is right, of {problem:?}", flight.outcome, exact.outcome);
            stops += usize::from(exact.outcome.is_stop());
            let name = || format!("in problem {index} of {kind:?}, {problem:?}");
            worst.take(error_of_events(problem, &flight, &exact)? / promise, name);
            worst.take(error_of_rows(problem, &flight, &exact)? / promise, name);
        }
        holds!(6 * judged >= *count, "only {judged} of {count} problems of {kind:?} are solved");
        holds!(has_both(judged, stops), "{stops} of {judged} of {kind:?} stop");
        solved += judged;
    }
    let found = worst.measurement();
    let remark = format!("{solved} problems; {}", found.remark);
    Ok(found.resolving(1.0).remark(remark).cases(solved))
}

/// The exit margin in double-double. `None` where stops in viscous stages leave it to a formula of the engine.
fn exact_margin(problem: &Problem, exact: &Flight<TwoFloat>) -> Found<Option<TwoFloat>> {
    let is_crossed = |index: usize| problem.start_of(index) < problem.exit_depth;
    let is_viscous = (0..problem.stages.len()).any(|index| is_crossed(index) && problem.stages[index].viscosity > 0.0);
    if !is_viscous {
        return Ok(Energy::new().exit_margin_in(&problem.cast::<TwoFloat>())?.map(|(margin, ..)| margin));
    }
    let speed = TwoFloat::from(problem.impact_speed);
    if exact.at(EventKind::Exit).is_some() {
        let squares = exact.events.iter().filter(|event| event.kind != EventKind::Rest).map(|event| {
            let share = event.state.velocity.over(speed);
            share * share
        });
        return Ok(squares.reduce(|a, b| if b.value() < a.value() { b } else { a }));
    }
    let law = &problem.stages[exact.stage];
    if law.end < problem.exit_depth || law.viscosity == 0.0 {
        return Ok(None);
    }
    // Minus twice the static work from rest to the exit, over M V0².
    let (rest, exit) = (exact.end.depth, TwoFloat::from(problem.exit_depth));
    let mean = TwoFloat::from(law.static_force) + TwoFloat::from(0.5 * law.stiffness) * (rest + exit);
    let lacking = TwoFloat::from(2.0) * mean * (exit - rest);
    Ok(Some(-lacking.over(TwoFloat::from(problem.mass)).over(speed).over(speed)))
}

/// The largest of the quotients of bound and error that nine tenths of the problems of each of `kinds` keep to, whose
/// shares, errors over their bounds, `shares` gives with the worst of them.
fn quotient(kinds: &[Kind], count: usize, least: f64, shares: impl Fn(Kind) -> Found<(Vec<f64>, Worst)>) -> Found {
    let (mut most, mut judged, mut remark) = (0.0, 0, Vec::new());
    for &kind in kinds {
        let (mut shares, worst) = shares(kind)?;
        holds!(6 * shares.len() >= count, "only {} of {count} problems of {kind:?} have a bound", shares.len());
        holds!(worst.value <= 1.0, "an error of {} bounds, {}", worst.value, worst.place);
        judged += shares.len();
        shares.sort_by(f64::total_cmp);
        let upper = shares[shares.len() - 1 - shares.len() / 10];
        holds!(1.0 / upper >= least, "errors of {upper:.3} bounds are no rarity among {kind:?}");
        most = worse(most, 1.0 / upper);
        remark.push(format!("{kind:?} {:.1}", 1.0 / upper));
    }
    Ok(Measurement::new(most).remark(remark.join(", ")).cases(judged))
}

fn margin_bound(MarginBound { kinds, count, least, rtol }: &MarginBound, subject: &Subject<'_>) -> Found {
    let method = subject.method(*rtol)?;
    quotient(kinds, *count, *least, |kind| {
        let mut worst = Worst::default();
        let mut shares = Vec::new();
        for (index, problem) in problems(subject, kind, *count)?.iter().enumerate() {
            let Some(flight) = attempt(&method, problem, Detail::End)? else { continue };
            let Some(exact) = exact_margin(problem, &in_double_double(problem)?)? else { continue };
            let (margin, bound) = flight
                .exit_margin
                .zip(flight.exit_margin_error)
                .ok_or_else(|| NotMeasured::broken(format!("no margin of {problem:?}")))?;
            let error = (TwoFloat::from(margin) - exact).value().abs();
            // Far from zero the rounding of the margin itself may exceed a bound that is there to decide its sign.
            let rounding = 4.0 * f64::EPSILON * exact.value().abs();
            worst.take((error - rounding).max(0.0) / bound, || format!("of problem {index} of {kind:?}, {problem:?}"));
            shares.push(error / bound);
        }
        Ok((shares, worst))
    })
}

fn critical_bound(CriticalBound { kinds, count, least, rtol }: &CriticalBound, subject: &Subject<'_>) -> Found {
    let method = subject.method(*rtol)?;
    quotient(kinds, *count, *least, |kind| {
        let mut worst = Worst::default();
        let mut shares = Vec::new();
        for (index, problem) in problems(subject, kind, *count)?.iter().enumerate() {
            let Some((share, spacing)) = critical_share(&method, problem)? else { continue };
            worst.take((share - spacing).max(0.0), || format!("of problem {index} of {kind:?}, {problem:?}"));
            shares.push(share);
        }
        Ok((shares, worst))
    })
}

/// Error of the critical velocity of `problem`, whose stages are the same at any speed, and the spacing of numbers there,
/// over its error bar; `None` where the method has no solution or any speed perforates.
fn critical_share(method: &Method, problem: &Problem) -> Found<Option<(f64, f64)>> {
    let at = |impact_speed: f64| Problem { impact_speed, ..problem.clone() };
    let found = match critical_velocity(|speed| Ok(at(speed)), method.integrator()) {
        Ok(found) => found,
        Err(error) if error.is_usage() => return Ok(None),
        Err(error) => return Err(NotMeasured::broken(format!("{error}, of {problem:?}"))),
    };
    if found.velocity == 0.0 {
        return Ok(None);
    }
    let bar = found.error_bar.ok_or_else(|| NotMeasured::broken("no error bar"))?;
    let energy = 0.5 * problem.mass * found.velocity * found.velocity;
    holds!((found.energy / energy - 1.0).abs() <= 4.0 * f64::EPSILON, "E_c {} J of V_c {found:?}", found.energy);
    let perforates = |speed: f64| -> Found<bool> {
        let flight = in_double_double(&at(speed))?;
        Ok(flight.at(EventKind::Exit).is_some_and(|state| state.velocity.value() > 0.0))
    };
    let spacing = 2.0 * f64::EPSILON * found.velocity;
    let (mut low, mut high) = (found.velocity - bar - spacing, found.velocity + bar + spacing);
    let is_inside = !perforates(low)? && perforates(high)?;
    holds!(is_inside, "V_c is not in {} ± {bar:e} m/s, of {problem:?}", found.velocity);
    // To a ten-thousandth of the bar, or to neighbouring numbers.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if high - low <= 2e-4 * bar || middle <= low || middle >= high {
            break;
        }
        if perforates(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(Some(((0.5 * (low + high) - found.velocity).abs() / bar, spacing / bar)))
}

/// Tolerances of [`response`].
const RUNGS: i32 = 4;

fn response(&Response { from, to, slope, level, count }: &Response, subject: &Subject<'_>) -> Found {
    let ladder = (0..RUNGS).map(|rung| from * (to / from).powf(f64::from(rung) / f64::from(RUNGS - 1)));
    let methods = ladder.map(|rtol| Ok((rtol, subject.method(Some(rtol))?))).collect::<Found<Vec<_>>>()?;
    let mut sums = vec![(0.0, 0.0); methods.len()];
    let mut judged = 0;
    for kind in [Kind::Tunnel, Kind::SpringAndDrag, Kind::Viscous, Kind::Several] {
        for problem in problems(subject, kind, count)? {
            let exact = in_double_double(&problem)?;
            let mut errors = Vec::new();
            for (_, method) in &methods {
                let Some(flight) = attempt(method, &problem, Detail::Events)? else { break };
                // Near the margin a loose tolerance may be undecided, or stop in front of a boundary.
                if flight.outcome != exact.outcome || flight.stage != exact.stage {
                    break;
                }
                let error = error_of_events(&problem, &flight, &exact)?;
                errors.push((error.max(f64::EPSILON).ln(), flight.cost.force_evaluations as f64));
            }
            if errors.len() == methods.len() {
                judged += 1;
                for (sum, (error, cost)) in sums.iter_mut().zip(errors) {
                    *sum = (sum.0 + error, sum.1 + cost);
                }
            }
        }
    }
    holds!(judged >= count, "only {judged} problems are solved at every tolerance");
    let mean = |(error, cost): &(f64, f64)| ((error / judged as f64).exp(), cost / judged as f64);
    let means: Vec<(f64, f64)> = sums.iter().map(mean).collect();
    let rises = means.windows(2).all(|pair| pair[1].1 > pair[0].1);
    holds!(rises, "the cost does not rise as the tolerance falls: {means:?}");
    let last = means.last().map_or(f64::NAN, |mean| mean.0 / to);
    holds!((0.1 * level..=10.0 * level).contains(&last), "the error at rtol {to:e} is {last:.2e} of it");
    let points = methods.iter().zip(&means);
    let shown: Vec<_> =
        points.clone().map(|((rtol, _), (error, cost))| format!("{rtol:.0e}: {error:.1e} at {cost:.0}")).collect();
    let found = rounding::slope(points.map(|((rtol, _), (error, _))| (*rtol, *error)));
    Ok(Measurement::new((found - slope).abs())
        .remark(format!("slope {found:.3}, level {last:.1e}; {}", shown.join(", "))))
}
