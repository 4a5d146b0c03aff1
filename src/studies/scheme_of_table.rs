//! Which scheme produced a table of step sizes? The one that reproduces every row within its printed digits.
//!
//! Candidates are the nine variants of [`CentralDifference`], and the one-step schemes of other codes with each of the
//! three treatments of events ([`Boundaries`]): forward and semi-implicit Euler, Heun, explicit midpoint, and the
//! classical Runge-Kutta scheme of fourth order. For a one-step scheme the treatments mean:
//!
//! - `step-end`: whole steps, the force that of the depth at which it is evaluated; stage ends, exit and rest are seen
//!   at the first step end past them;
//! - `interpolated`: the same steps; inside one, V runs linearly, and x along the parabola that starts with x(i), V(i)
//!   and meets x(i+1);
//! - `landed`: stage ends, exit and rest are reached by a shortened step of the scheme itself, and a stage end is
//!   followed by a step of the regular size.
//!
//! The coarsest row is compared first, where schemes differ most, and a scheme is dropped at the first row that
//! contradicts it.

use serde::Serialize;

use super::audit::{FlightRow, Table};
use super::error::Truth;
use super::formal_order::{Path, formal_order};
use super::quantity::Quantity;
use crate::integrators::central_difference::Step;
use crate::integrators::{Boundaries, CentralDifference, Detail, Integrator, VelocityAt};
use crate::physics::{EventKind, Problem, Stage, State};
use crate::text::count;

/// Steps of a flight at most: a row that needs more is not compared.
const STEPS_MAX: f64 = 2e6;

/// Steps of all flights at most: some tenths of a second.
const STEPS_TOTAL: f64 = 5e7;

/// Steps of a simulated flight at most.
const SIMULATED_MAX: u64 = 20_000;

/// Units of round-off that a value may be off by, besides one a step: the sums of another code run in another sequence.
const ULPS: f64 = 32.0;

/// A difference over the value that says more of the digits printed than of the scheme.
const FEW_DIGITS: f64 = 1e-3;

/// Candidates named in a sentence.
const NAMED_MAX: usize = 3;

/// How x and V advance by a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Advance {
    CentralDifference(VelocityAt),
    Euler,
    SemiImplicitEuler,
    Heun,
    Midpoint,
    RungeKutta4,
}

impl Advance {
    const ALL: [Self; 8] = [
        Self::CentralDifference(VelocityAt::LaggedHalfStep),
        Self::CentralDifference(VelocityAt::Centred),
        Self::CentralDifference(VelocityAt::PredictedHalfStep),
        Self::Euler,
        Self::SemiImplicitEuler,
        Self::Heun,
        Self::Midpoint,
        Self::RungeKutta4,
    ];

    /// x and V after a step `h` of a one-step scheme with the acceleration `a(x, V)`.
    fn step(self, a: impl Fn(f64, f64) -> f64, x: f64, v: f64, h: f64) -> (f64, f64) {
        let half = 0.5 * h;
        match self {
            Self::Euler => (x + h * v, v + h * a(x, v)),
            Self::Heun => {
                let first = a(x, v);
                let ahead = v + h * first;
                let second = a(x + h * v, ahead);
                (x + half * (v + ahead), v + half * (first + second))
            }
            Self::Midpoint => {
                let middle = v + half * a(x, v);
                (x + h * middle, v + h * a(x + half * v, middle))
            }
            Self::RungeKutta4 => {
                let (v1, a1) = (v, a(x, v));
                let (v2, a2) = (v + half * a1, a(x + half * v1, v + half * a1));
                let (v3, a3) = (v + half * a2, a(x + half * v2, v + half * a2));
                let (v4, a4) = (v + h * a3, a(x + h * v3, v + h * a3));
                (x + h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4), v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4))
            }
            // Central difference is no one-step scheme, and never asked for here.
            Self::SemiImplicitEuler | Self::CentralDifference(_) => {
                let ahead = v + h * a(x, v);
                (x + h * ahead, ahead)
            }
        }
    }
}

/// A scheme of equal steps: how it advances, and what it does about stage ends, exit and rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Scheme {
    advance: Advance,
    events: Boundaries,
}

/// What a scheme makes of a scene.
struct Answer {
    end: State,
    crater_end: Option<State>,
    steps: u64,
}

impl Answer {
    fn value(&self, quantity: Quantity) -> Option<f64> {
        let state = if quantity.is_at_crater_end() { self.crater_end? } else { self.end };
        match quantity {
            Quantity::Depth => Some(state.depth),
            Quantity::Time | Quantity::CraterEndTime => Some(state.time),
            Quantity::Velocity | Quantity::CraterEndVelocity => Some(state.velocity),
            Quantity::CriticalVelocity => None,
        }
    }
}

impl Scheme {
    /// Every candidate.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        Advance::ALL.into_iter().flat_map(|advance| Boundaries::ALL.map(|events| Self { advance, events }))
    }

    /// Name: `central-difference`, `euler`, `heun` ...
    pub(crate) fn name(self) -> &'static str {
        match self.advance {
            Advance::CentralDifference(_) => "central-difference",
            Advance::Euler => "euler",
            Advance::SemiImplicitEuler => "semi-implicit-euler",
            Advance::Heun => "heun",
            Advance::Midpoint => "midpoint",
            Advance::RungeKutta4 => "runge-kutta-4",
        }
    }

    /// Velocity rule of central difference.
    pub(crate) fn velocity(self) -> Option<VelocityAt> {
        match self.advance {
            Advance::CentralDifference(velocity) => Some(velocity),
            _ => None,
        }
    }

    /// Treatment of events.
    pub(crate) fn events(self) -> Boundaries {
        self.events
    }

    /// The end of `problem` with steps of `step` (s); `None` if it takes too many.
    pub(crate) fn end(self, problem: &Problem, step: f64) -> Option<State> {
        self.solve(problem, step, SIMULATED_MAX).map(|answer| answer.end)
    }

    /// The end of `problem` with steps of `step` (s); `None` if it does not come within `max_steps`.
    fn solve(self, problem: &Problem, step: f64, max_steps: u64) -> Option<Answer> {
        let Some(velocity) = self.velocity() else { return self.in_one_steps(problem, step, max_steps) };
        let scheme = CentralDifference { max_steps, ..CentralDifference::uniform(step, velocity, self.events) };
        let flight = scheme.solve(problem, Detail::Events).ok()?;
        Some(Answer { end: flight.end, crater_end: flight.crater_end(), steps: flight.cost.steps })
    }

    fn in_one_steps(self, problem: &Problem, h: f64, max_steps: u64) -> Option<Answer> {
        let laws: Vec<Stage> = problem.stages.iter().map(|law| law.per_mass(problem.mass)).collect();
        // The end of a stage at the exit, or past it, changes nothing.
        let stage_at = |x: f64| {
            let behind = |law: &&Stage| law.end <= x && law.end < problem.exit_depth;
            laws.iter().take_while(behind).count().min(laws.len() - 1)
        };
        let lands = self.events == Boundaries::Landed;
        let is_located = self.events != Boundaries::StepEnd;
        let (mut state, mut stage) = (State::at_impact(problem), stage_at(0.0));
        // Whole steps since `since`: a running sum of steps would round off.
        let (mut since, mut count) = (0.0, 0.0);
        let (mut crater_end, mut steps) = (None, 0);
        let is_crater_end = |index: usize| EventKind::boundary(problem, index) == EventKind::CraterEnd;
        while steps < max_steps {
            let law = laws[stage];
            let start = if stage == 0 { f64::NEG_INFINITY } else { laws[stage - 1].end };
            let advance = |part: f64| {
                // A step that lands on the end of its stage has one law. Nearly all others stay inside of theirs.
                let is_here = |x: f64| lands || start <= x && x < law.end;
                let a = |x: f64, v: f64| -if is_here(x) { law } else { laws[stage_at(x)] }.force(x, v);
                self.advance.step(a, state.depth, state.velocity, part)
            };
            let (x, v) = advance(h);
            if !(x.is_finite() && v.is_finite()) {
                return None;
            }
            steps += 1;
            let end = law.end.min(problem.exit_depth);
            let to = State { time: since + (count + 1.0) * h, depth: x, velocity: v };
            if x < end && v > 0.0 {
                (state, count) = (to, count + 1.0);
                continue;
            }
            if lands {
                let rests = |part: f64| advance(part).1 <= 0.0;
                let last = if v > 0.0 { h } else { first(h, rests) };
                let reaches = |part: f64| advance(part).0 >= end;
                let (part, is_place) = if reaches(last) { (first(last, reaches), true) } else { (last, false) };
                let velocity = if is_place { advance(part).1.max(0.0) } else { 0.0 };
                let depth = if is_place { end } else { advance(part).0 };
                state = State { time: state.time + part, depth, velocity };
                (since, count) = (state.time, 0.0);
                if !is_place || end >= problem.exit_depth {
                    return Some(Answer { end: state, crater_end, steps });
                }
                if is_crater_end(stage) {
                    crater_end = Some(state);
                }
                stage = stage_at(end);
                continue;
            }
            // The parabola that starts with V(i) and meets x(i+1).
            let deceleration = 2.0 * (state.velocity - (x - state.depth) / h) / h;
            let step = Step { from: state, to, deceleration, size: h };
            let mut deepest = state.depth;
            for (index, law) in laws.iter().enumerate().skip(stage) {
                let Some(passed) = (law.end <= problem.exit_depth).then(|| step.passed(law.end, is_located)).flatten()
                else {
                    break;
                };
                deepest = law.end;
                if is_crater_end(index) {
                    crater_end = Some(passed);
                }
            }
            let exit = if problem.has_exit() { step.passed(problem.exit_depth, is_located) } else { None };
            if let Some(end) = exit.or_else(|| step.at_rest(deepest, is_located)) {
                return Some(Answer { end, crater_end, steps });
            }
            (state, count, stage) = (to, count + 1.0, stage_at(x));
        }
        None
    }

    /// Formal order of `quantity`; `None` where the flight fixes it, or where it is not known.
    fn formal_order(self, path: Path, quantity: Quantity) -> Option<f64> {
        // That flight is another one than the critical flight.
        if quantity == Quantity::CriticalVelocity {
            return None;
        }
        let of_second = formal_order(self.velocity().unwrap_or(VelocityAt::Centred), self.events, &path, quantity)?;
        match self.advance {
            Advance::Euler | Advance::SemiImplicitEuler => Some(1.0),
            // Of the interpolation, or of the scheme at steps far below those in use.
            Advance::RungeKutta4 if of_second > 1.0 => None,
            _ => Some(of_second),
        }
    }
}

/// The first part of a step, up to `whole`, of which `is_past` holds, as it does of the whole.
fn first(whole: f64, is_past: impl Fn(f64) -> bool) -> f64 {
    let (mut before, mut past) = (0.0, whole);
    loop {
        let middle = 0.5 * (before + past);
        // The interval halves until its ends are neighbours: some sixty times, and at most as often as there are exponents.
        if middle <= before || middle >= past {
            return past;
        }
        if is_past(middle) { past = middle } else { before = middle }
    }
}

/// The largest difference between a scheme and rows of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Difference {
    /// Where: the quantity.
    pub quantity: Quantity,
    /// Where: the step (s).
    pub dt_s: f64,
    /// How much, in the unit of the quantity; infinite (`null` in JSON) where the scheme does not have it.
    #[cfg_attr(feature = "report", schemars(with = "Option<f64>"))]
    pub difference: f64,
    /// Over the value, for velocities over V0.
    #[serde(skip)]
    relative: f64,
}

/// A scheme that reproduces the rows, or comes nearest to them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Candidate {
    /// `central-difference`, `euler`, `semi-implicit-euler`, `heun`, `midpoint` or `runge-kutta-4`.
    pub name: &'static str,
    /// Velocity rule of central difference; `null` for the others.
    pub velocity: Option<&'static str>,
    /// Treatment of events.
    pub events: &'static str,
    /// Largest difference from a row, over the value, for velocities over V0; `null` in JSON if it is infinite.
    #[cfg_attr(feature = "report", schemars(with = "Option<f64>"))]
    pub largest_difference: f64,
    #[serde(skip)]
    scheme: Scheme,
}

/// Which schemes reproduce a table: `scheme` of `penetrode audit --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Identification {
    /// The schemes that reproduce every row compared; none if no scheme does.
    pub candidates: Vec<Candidate>,
    /// The scheme that comes nearest, and its largest difference, where none reproduces every row.
    pub nearest: Option<Nearest>,
    /// Rows compared.
    pub rows: usize,
    /// Rows left out, whose flights would take too many steps.
    pub rows_skipped: usize,
    /// What decides the formal orders.
    #[serde(skip)]
    path: Path,
    /// Quantities compared.
    #[serde(skip)]
    quantities: Vec<Quantity>,
}

/// The scheme that comes nearest to a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Nearest {
    /// Which.
    #[serde(flatten)]
    pub scheme: Candidate,
    /// Its largest difference.
    #[serde(flatten)]
    pub difference: Difference,
}

impl Candidate {
    fn new(scheme: Scheme, worst: Difference) -> Self {
        Self {
            name: scheme.name(),
            velocity: scheme.velocity().map(VelocityAt::name),
            events: scheme.events.name(),
            largest_difference: worst.relative,
            scheme,
        }
    }

    /// As the options of `solve` have it: `lagged, step-end`; other schemes by name: `heun, landed`.
    fn words(&self) -> String {
        format!("{}, {}", self.velocity.unwrap_or(self.name), self.events)
    }
}

impl Identification {
    /// Formal order of `quantity`; `None` where the schemes found differ in it, where the flight fixes the quantity, or
    /// where none was found.
    pub fn formal_order(&self, quantity: Quantity) -> Option<f64> {
        let mut orders = self.candidates.iter().map(|found| found.scheme.formal_order(self.path, quantity));
        let first = orders.next()??;
        orders.all(|order| order == Some(first)).then_some(first)
    }

    /// Whether the order `given` of `quantity` is theirs. That of Runge-Kutta 4 is four, or more by chance, where its steps land on the
    /// events.
    pub fn bears_out(&self, quantity: Quantity, given: f64) -> bool {
        let lands = |found: &Candidate| {
            found.scheme.advance == Advance::RungeKutta4 && found.scheme.events == Boundaries::Landed
        };
        match self.formal_order(quantity) {
            Some(order) => order == given,
            None => given == 4.0 && !self.candidates.is_empty() && self.candidates.iter().all(lands),
        }
    }

    /// Whether a scheme reproduces `quantity` in all of `rows` rows, three at least. A quantity that was not compared is
    /// not reproduced.
    pub fn reproduces(&self, quantity: Quantity, rows: usize) -> bool {
        let is_compared = self.quantities.contains(&quantity);
        is_compared && rows >= 3 && self.rows == rows && !self.candidates.is_empty()
    }

    /// What was found, in one sentence.
    pub fn sentence(&self) -> String {
        let skipped = match self.rows_skipped {
            0 => String::new(),
            rows => format!("; {} of too many steps not compared", count(rows, "row")),
        };
        if let Some(Nearest { scheme, difference: Difference { quantity, dt_s, difference, .. } }) = &self.nearest {
            let off = match quantity {
                _ if difference.is_infinite() => "which has no value".to_owned(),
                Quantity::Depth => format!("{difference:.1e} m off"),
                Quantity::Time | Quantity::CraterEndTime => format!("{difference:.1e} s off"),
                _ => format!("{difference:.1e} m/s off"),
            };
            let words = scheme.words();
            let all = Scheme::all().count();
            return format!(
                "none of the {all} schemes; nearest {words}: {off} in {quantity} at dt = {dt_s:e} s{skipped}"
            );
        }
        let words: Vec<String> = self.candidates.iter().map(Candidate::words).collect();
        let more = match words.len().saturating_sub(NAMED_MAX) {
            0 => String::new(),
            more => format!(" or {more} more"),
        };
        let worst = self.candidates.iter().map(|found| found.largest_difference).fold(0.0, f64::max);
        let verb = if words.len() == 1 { "reproduces" } else { "reproduce" };
        let rows = if self.rows == 1 { "the one row".to_owned() } else { format!("all {} rows", self.rows) };
        let words = words[..words.len().min(NAMED_MAX)].join(" or ");
        let few = if worst > FEW_DIGITS { ", for its digits are that few" } else { "" };
        format!("{words}{more} {verb} {rows} (largest difference {worst:.0e}{few}){skipped}")
    }
}

/// The difference of a scheme from a row, and whether it lies within the digits printed; `steps` are added up.
fn compare(scheme: Scheme, problem: &Problem, row: &FlightRow, duration: f64, steps: &mut f64) -> (bool, Difference) {
    let max_steps = 2.0 * duration / row.step + 1e3;
    let answer = scheme.solve(problem, row.step, max_steps as u64);
    *steps += answer.as_ref().map_or(max_steps, |answer| answer.steps as f64);
    let speed = problem.impact_speed;
    let mut is_within = true;
    let mut worst = Difference { quantity: Quantity::Depth, dt_s: row.step, difference: 0.0, relative: 0.0 };
    for &(quantity, value, half_unit) in &row.values {
        let found = answer.as_ref().and_then(|answer| Some((answer.value(quantity)?, answer.steps as f64)));
        let (difference, taken) = found.map_or((f64::INFINITY, 0.0), |(found, taken)| ((found - value).abs(), taken));
        let scale = if quantity.is_over_impact_speed() { speed } else { value.abs() };
        let round_off = f64::EPSILON * (ULPS + taken) + row.step_rounding;
        is_within &= difference <= half_unit + round_off * scale;
        let relative = if difference == 0.0 { 0.0 } else { difference / scale };
        if relative > worst.relative {
            worst = Difference { quantity, dt_s: row.step, difference, relative };
        }
    }
    (is_within, worst)
}

/// The schemes that reproduce `table` within its printed digits, if it has quantities of a flight through `problem`.
///
/// `None` where there is nothing to compare: no such column, no row that takes at most 2 million steps, or a problem
/// without a solution.
pub fn identify(problem: &Problem, table: &Table) -> Option<Identification> {
    let exact = Truth::of(problem).ok()?.flight;
    let duration = exact.end.time;
    let mut all = table.flights();
    if exact.outcome.is_stop() {
        // What a code prints for the velocity at rest is a matter of taste: zero, or that of the last step.
        for row in &mut all {
            row.values.retain(|(quantity, ..)| *quantity != Quantity::Velocity);
        }
        all.retain(|row| !row.values.is_empty());
    }
    let rows: Vec<&FlightRow> = all.iter().rev().filter(|row| duration / row.step <= STEPS_MAX).collect();
    let mut steps = 0.0;
    // What each scheme is off by at most in the rows so far, and whether it reproduces them.
    let mut found: Vec<(Scheme, bool, Difference)> = Vec::new();
    let mut compared = 0;
    for row in &rows {
        if steps > STEPS_TOTAL {
            break;
        }
        let mut next = |scheme| {
            let (is_within, difference) = compare(scheme, problem, row, duration, &mut steps);
            (scheme, is_within, difference)
        };
        if compared == 0 {
            found = Scheme::all().map(next).collect();
        } else {
            for (scheme, fits, worst) in found.iter_mut().filter(|(_, fits, _)| *fits) {
                let (_, is_within, difference) = next(*scheme);
                *fits = is_within;
                if difference.relative > worst.relative {
                    *worst = difference;
                }
            }
        }
        compared += 1;
        if !found.iter().any(|(_, fits, _)| *fits) {
            break;
        }
    }
    let candidates: Vec<Candidate> =
        found.iter().filter(|(_, fits, _)| *fits).map(|(scheme, _, worst)| Candidate::new(*scheme, *worst)).collect();
    let nearest = if candidates.is_empty() { Some(nearest(problem, &rows[..compared], duration)?) } else { None };
    let rows_skipped = all.len() - if candidates.is_empty() { rows.len() } else { compared };
    let quantities = rows.first()?.values.iter().map(|(quantity, ..)| *quantity).collect();
    let path = Path::of(problem, &exact);
    Some(Identification { candidates, nearest, rows: compared, rows_skipped, path, quantities })
}

/// The scheme whose largest difference from `rows` is the least.
fn nearest(problem: &Problem, rows: &[&FlightRow], duration: f64) -> Option<Nearest> {
    let worst = |scheme: Scheme| {
        let differences = rows.iter().map(|row| compare(scheme, problem, row, duration, &mut 0.0).1);
        let worst = differences.max_by(|a, b| a.relative.total_cmp(&b.relative))?;
        Some(Nearest { scheme: Candidate::new(scheme, worst), difference: worst })
    };
    let all = Scheme::all().filter_map(worst);
    all.min_by(|a, b| a.difference.relative.total_cmp(&b.difference.relative))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use std::fmt::Write;

    use super::*;
    use crate::testing::shipped;

    const STEPS: [f64; 5] = [4e-5, 2e-5, 1e-5, 5e-6, 2.5e-6];

    fn problem(name: &str) -> Problem {
        shipped(name).problem().unwrap()
    }

    /// The results of `scheme` with as many decimals of the mantissa.
    fn table(scheme: Scheme, problem: &Problem, decimals: usize) -> String {
        let mut text = "dt_s,depth_m,time_s,velocity_m_s\n".to_owned();
        for step in STEPS {
            let State { depth, time, velocity } = scheme.solve(problem, step, 100_000).unwrap().end;
            writeln!(text, "{step},{depth:.decimals$e},{time:.decimals$e},{velocity:.decimals$e}").unwrap();
        }
        text
    }

    fn identified(problem: &Problem, text: &str) -> Identification {
        identify(problem, &Table::read("run.csv", text.as_bytes()).unwrap()).unwrap()
    }

    #[test]
    fn each_scheme_is_found_behind_its_table_of_seven_digits_and_of_all() {
        for name in ["perforate", "tunnel", "jump"] {
            let problem = problem(name);
            for scheme in Scheme::all() {
                for decimals in [6, 16] {
                    let found = identified(&problem, &table(scheme, &problem, decimals));
                    let has_it = found.candidates.iter().any(|candidate| candidate.scheme == scheme);
                    assert!(has_it, "{name}, {scheme:?}: {}", found.sentence());
                    assert!(found.candidates.len() <= 2, "{name}, {scheme:?}: {}", found.sentence());
                    assert_eq!((found.rows, found.rows_skipped, found.nearest), (STEPS.len(), 0, None));
                }
            }
        }
    }

    #[test]
    fn a_table_of_no_scheme_has_a_nearest_one_and_its_largest_difference() {
        let problem = problem("tunnel");
        let scheme = Scheme { advance: Advance::Heun, events: Boundaries::Landed };
        let mut text = "dt_s,depth_m\n".to_owned();
        for step in STEPS {
            let depth = scheme.solve(&problem, step, 100_000).unwrap().end.depth;
            writeln!(text, "{step},{:.9}", depth + 1e-7).unwrap();
        }
        let found = identified(&problem, &text);
        assert_eq!(found.candidates, []);
        let Nearest { scheme: nearest, difference } = found.nearest.unwrap();
        assert_eq!((nearest.scheme, difference.quantity, difference.dt_s), (scheme, Quantity::Depth, 4e-5));
        assert!((difference.difference - 1e-7).abs() < 1e-9);
        let sentence = "none of the 24 schemes; nearest heun, landed: 1.0e-7 m off in depth at dt = 4e-5 s";
        assert_eq!(found.sentence(), sentence);
        assert_eq!(found.formal_order(Quantity::Depth), None);
    }

    /// Written down without regard to the code above.
    #[test]
    fn a_loop_of_a_few_lines_is_recognised() {
        let problem = problem("perforate");
        let [crater, tunnel] = [problem.stages[0], problem.stages[1]];
        let acceleration = |x: f64, v: f64| -(if x < crater.end { crater } else { tunnel }).force(x, v) / problem.mass;
        let mut text = "dt_s,depth_m,time_s,velocity_m_s\n".to_owned();
        for dt in STEPS {
            let (mut t, mut x, mut v) = (0.0, 0.0, problem.impact_speed);
            while x < problem.exit_depth {
                v += dt * acceleration(x, v);
                x += dt * v;
                t += dt;
            }
            writeln!(text, "{dt},{x},{t},{v}").unwrap();
        }
        let found = identified(&problem, &text);
        assert!(
            found.sentence().starts_with("semi-implicit-euler, step-end reproduces all 5 rows"),
            "{}",
            found.sentence()
        );
        assert_eq!(found.formal_order(Quantity::Velocity), Some(1.0));
    }

    #[test]
    fn schemes_of_other_codes_have_their_formal_orders() {
        for name in ["perforate", "tunnel", "jump"] {
            let problem = problem(name);
            let exact = Truth::of(&problem).unwrap().flight;
            let path = Path::of(&problem, &exact);
            for scheme in Scheme::all().filter(|scheme| scheme.events != Boundaries::StepEnd) {
                if scheme.velocity().is_some() {
                    continue;
                }
                for quantity in [Quantity::Depth, Quantity::Time, Quantity::Velocity] {
                    let Some(formal) = scheme.formal_order(path, quantity) else { continue };
                    let value = super::super::error::value_of(quantity, &exact).unwrap();
                    // The place of a stage end in its step makes a noise: the mean of many steps.
                    let error = |step: f64| {
                        let found = |i| scheme.solve(&problem, step * (1.0 + 0.03 * f64::from(i)), 100_000).unwrap();
                        let square = |i| (found(i).value(quantity).unwrap() - value).powi(2);
                        (0..12).map(square).sum::<f64>().sqrt()
                    };
                    let order = (error(1.25e-6) / error(1.5625e-7)).log(8.0);
                    assert!(
                        (order - formal).abs() < 0.2,
                        "{name}, {scheme:?}, {quantity}: {order:.3}, formal {formal}"
                    );
                }
            }
        }
    }
}
