//! How are very many craters and tunnels solved at once? In lanes, by the Taylor series of [`super::taylor`].
//!
//! A lane is one scene. All lanes take the same operations, each on its own numbers, so the compiler turns the loop
//! over lanes into vector instructions; nothing here names one. A lane that has ended makes room for the next scene.
//!
//! **Same series, own units.** In units of V0 and 1/w, `w² = c/M`, every crater is the same flight `u' = -y, y' = u`,
//! and its coefficients are constants. In units of V and `T = V/(p + q V²)` (per unit mass) every tunnel is
//!
//! ```text
//! u' = -((1 - b) + b u²),  u(0) = 1,  b = q V²/(p + q V²)
//! v[0] = 1,  v[1] = -1,  v[k+1] = -(2 b/(k+1)) (v[k] + sum over 0 < i < k/2 of v[i] v[k-i] + [k even] v[k/2]²/2)
//! ```
//!
//! so one number decides coefficients and step.
//!
//! **One evaluation a step.** The series gives a guess of the time to rest or exit (by reversion; it may be poor). Where
//! the guess lies inside the step, the step ends there instead. Close to the event the law itself gives four
//! derivatives, and the remaining time is solved from them; otherwise the step was a step like any other.
//!
//! **What is not proven is not answered.** An exit margin within ten error bounds of zero, a crater that all but stops the
//! projectile at k d, numbers of extreme magnitude, stages other than one crater and one tunnel: all these go
//! to the scalar [`Taylor`], whose answer is taken as it is. Laws of one's own that go by series do so side by side
//! ([`side_by_side`]), with the same answer.
//!
//! **Bit by bit.** A result depends on nothing but its scene: not on the neighbours, on the number of lanes, or on the
//! processor. Products and sums are never fused, divisions and roots are rounded correctly everywhere.

#![expect(
    clippy::cast_lossless,
    clippy::out_of_bounds_indexing,
    clippy::needless_bitwise_bool,
    clippy::struct_field_names,
    reason = "one shape for every lane: unrolled coefficients behind a constant bound, and conditions without a branch"
)]

use std::f64::consts::FRAC_PI_2;

use super::instructions::{Instructions, Work};
use super::law_series::side_by_side;
use super::outcome::{Cost, Detail, Flight, Integrator, Solved};
use super::taylor::Taylor;
use crate::physics::{Event, EventKind, Outcome, Problem, State, Target, exit_energy};

/// Coefficients of the series in the tunnel. Work a unit of progress, `(K²/2 + 150)/eps^(1/(K-1))`, is least and flat
/// from 22 to 28.
const COEFFICIENTS: usize = 24;

/// Coefficients of V that the crater counts as evaluated: the constants of `u` and `y` up to the 21st power.
const CRATER_COEFFICIENTS: u64 = 22;

/// Scenes prepared at a time; some hundred kilobytes.
const BLOCK: usize = 1024;

/// Lanes at work: two vectors of the widest kind.
const WIDTH: usize = 16;

/// Steps after which a lane is given to the scalar integrator. The widest drag of a sane scene takes forty.
const STEPS_MAX: f64 = 400.0;

/// Longest step in its own unit of time; rest without drag is at 1.
const SPAN_MAX: f64 = 64.0;

/// Longest last correction, in the unit of time: its neglected terms are of fifth order.
const REACH: f64 = 5e-4;

/// A crater that ends within this of the depth of rest, relatively, goes to the scalar integrator.
const TOUCH: f64 = 1e-4;

/// How many error bounds an exit margin must be away from zero.
const BOUNDS: f64 = 10.0;

/// Magnitudes that leave room for squares and quotients.
const SANE: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// A solution without its list of events: what a table of results holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// How it ended.
    pub outcome: Outcome,
    /// Index from 0 of the stage in which it ended.
    pub stage: usize,
    /// State at the end: at rest `X, T, 0`; perforated: exit depth, time of exit, V_r.
    pub end: State,
    /// State at x = k d, if it was reached.
    pub crater_end: Option<State>,
    /// Exit margin, as [`Flight::exit_margin`].
    pub exit_margin: Option<f64>,
    /// Its error bound, as [`Flight::exit_margin_error`].
    pub exit_margin_error: Option<f64>,
    /// Work done.
    pub cost: Cost,
}

impl From<&Flight> for Summary {
    fn from(flight: &Flight) -> Self {
        Self {
            outcome: flight.outcome,
            stage: flight.stage,
            end: flight.end,
            crater_end: flight.crater_end(),
            exit_margin: flight.exit_margin,
            exit_margin_error: flight.exit_margin_error,
            cost: flight.cost,
        }
    }
}

impl Summary {
    /// The full solution, to compare with others; events of a crater and a tunnel only.
    pub fn flight(&self) -> Flight {
        let mut events = super::Events::new();
        if let Some(state) = self.crater_end {
            events.push(Event { kind: EventKind::CraterEnd, state });
        }
        let stops = self.outcome.is_stop() || (self.outcome == Outcome::Undecided && self.end.velocity <= 0.0);
        events.push(Event { kind: if stops { EventKind::Rest } else { EventKind::Exit }, state: self.end });
        Flight {
            outcome: self.outcome,
            stage: self.stage,
            end: self.end,
            events,
            exit_margin: self.exit_margin,
            exit_margin_error: self.exit_margin_error,
            cost: self.cost,
            trajectory: Vec::new(),
            step_limit: None,
            notes: Vec::new(),
        }
    }
}

/// Solves many problems at once.
///
/// # Example
/// ```
/// use penetrode::integrators::lanes::Batch;
/// use penetrode::physics::{Outcome, Problem, Stage};
///
/// // Constant resistance: X = M V0²/(2 P).
/// let problem = Problem::crater_and_tunnel(2.0, 300.0, None, Stage::tunnel(1.0e6, 0.0));
/// let flights = Batch::new().solve(&[problem.clone(), problem]);
/// let first = flights[0].as_ref().unwrap();
/// assert_eq!(first.outcome, Outcome::StoppedInTunnel);
/// assert!((first.end.depth - 0.09).abs() < 1e-16);
/// assert_eq!(flights[0], flights[1]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Batch {
    instructions: Instructions,
}

impl Default for Batch {
    fn default() -> Self {
        Self::new()
    }
}

impl Batch {
    /// With the widest vectors that the processor has.
    pub fn new() -> Self {
        Self { instructions: Instructions::detect() }
    }

    /// Solves `problems`; answers come in their order, one each.
    ///
    /// The error of an answer is the one that [`Taylor`] gives for that problem; it stops no other.
    pub fn solve(&self, problems: &[Problem]) -> Vec<Solved<Summary>> {
        let mut answers = Vec::with_capacity(problems.len());
        let mut block = Block::default();
        for part in problems.chunks(BLOCK) {
            block.prepare(part);
            self.instructions.run(&mut block);
            // Made once one is asked for. Lanes answer none of those that it serves, whose coefficients are no numbers.
            let mut with_laws = None;
            for (index, problem) in part.iter().enumerate() {
                let alone = || {
                    let flight = if side_by_side::serves(problem) {
                        let solve = || side_by_side::solve(part, self.instructions).into_iter();
                        with_laws.get_or_insert_with(solve).next()
                    } else {
                        None
                    };
                    let flight = flight.unwrap_or_else(|| Taylor::default().solve(problem, Detail::Events));
                    flight.map(|flight| Summary::from(&flight))
                };
                answers.push(block.summary(index, problem).map_or_else(alone, Ok));
            }
        }
        answers
    }
}

/// State of a scene. It is a number like the others, so lanes need no second type.
mod status {
    /// Moving in the tunnel.
    pub(super) const MOVING: f64 = 0.0;
    /// At rest.
    pub(super) const REST: f64 = 1.0;
    /// At the exit depth.
    pub(super) const EXIT: f64 = 2.0;
    /// For the scalar integrator.
    pub(super) const GIVEN_UP: f64 = 3.0;
}

/// Scenes in columns.
#[derive(Default)]
struct Block {
    count: usize,
    /// Impact speed V0 (m/s).
    impact_speed: Column,
    /// c/M (1/s²).
    stiffness: Column,
    /// The first limit (m): k d or the exit depth.
    first_limit: Column,
    /// Exit depth (m), infinite without one.
    exit_depth: Column,
    /// P/M (m/s²) and Q/M (1/m).
    static_force: Column,
    drag: Column,
    /// State reached: time (s), depth (m), velocity (m/s).
    time: Column,
    depth: Column,
    velocity: Column,
    /// State at k d: time (s) and velocity (m/s).
    crater_time: Column,
    crater_velocity: Column,
    /// Error bound of W/V0².
    bound: Column,
    /// Steps in the tunnel.
    steps: Column,
    /// One of [`status`].
    status: Column,
}

/// One number of each scene.
struct Column([f64; BLOCK]);

impl Default for Column {
    fn default() -> Self {
        Self([0.0; BLOCK])
    }
}

impl Block {
    /// Takes over the numbers of at most [`BLOCK`] problems.
    fn prepare(&mut self, problems: &[Problem]) {
        self.count = problems.len();
        assert!(self.count <= BLOCK, "{} problems in a block of {BLOCK}", self.count);
        for (i, problem) in problems.iter().enumerate() {
            let sane = |value: f64| SANE.contains(&value);
            let (crater, tunnel) = match (&problem.stages[..], problem.crater) {
                ([tunnel], None) => (None, tunnel),
                ([crater, tunnel], Some(0)) => (Some(crater), tunnel),
                _ => {
                    self.status.0[i] = status::GIVEN_UP;
                    continue;
                }
            };
            let mass = problem.mass;
            let (p, q) = (tunnel.static_force / mass, tunnel.drag / mass);
            let (stiffness, depth) = crater.map_or((0.0, 0.0), |c| (c.stiffness / mass, c.end));
            let is_tunnel = tunnel.stiffness == 0.0 && tunnel.viscosity == 0.0 && tunnel.end == f64::INFINITY;
            let is_crater = crater.is_none_or(|c| {
                c.static_force == 0.0 && c.viscosity == 0.0 && c.drag == 0.0 && sane(stiffness) && sane(depth)
            });
            let is_sane = sane(problem.impact_speed)
                && sane(p)
                && (q == 0.0 || sane(q))
                && (sane(problem.exit_depth) || problem.exit_depth == f64::INFINITY);
            let fits = problem.target == Target::CraterAndTunnel && is_tunnel && is_crater && is_sane;
            self.status.0[i] = if fits { status::MOVING } else { status::GIVEN_UP };
            self.impact_speed.0[i] = problem.impact_speed;
            self.stiffness.0[i] = stiffness;
            self.first_limit.0[i] = if depth < problem.exit_depth { depth } else { problem.exit_depth };
            self.exit_depth.0[i] = problem.exit_depth;
            self.static_force.0[i] = p;
            self.drag.0[i] = q;
            self.steps.0[i] = 0.0;
        }
    }

    /// The answer to `problem`, the `index`-th; `None` where the lanes have none.
    fn summary(&self, index: usize, problem: &Problem) -> Option<Summary> {
        let ending = self.status.0[index];
        let through = ending == status::EXIT;
        if !(through || ending == status::REST) {
            return None;
        }
        let end = State {
            time: self.time.0[index],
            depth: self.depth.0[index],
            velocity: if through { self.velocity.0[index] } else { 0.0 },
        };
        let crater = problem.crater.map(|_| problem.stages[0].end);
        let crater_end = crater.filter(|end_of_crater| end.depth >= *end_of_crater).map(|depth| State {
            time: self.crater_time.0[index],
            depth,
            velocity: self.crater_velocity.0[index],
        });
        let in_tunnel = self.steps.0[index] > 0.0;
        let stage = usize::from(crater.is_some() && in_tunnel);
        let margin = problem.has_exit().then(|| {
            let scale = problem.impact_speed;
            if through {
                let relative = end.velocity / scale;
                relative * relative
            } else {
                exit_energy::energy_beyond_stop(problem, stage, end.depth) / scale / scale
            }
        });
        let bound = self.bound.0[index];
        if margin.is_some_and(|m| !(m.abs() > BOUNDS * bound) || (m > 0.0) != through) {
            return None;
        }
        let crater_steps = u64::from(crater.is_some());
        let tunnel_steps = self.steps.0[index] as u64;
        Some(Summary {
            outcome: if through { Outcome::Perforated } else { problem.stop_in(stage) },
            stage,
            end,
            crater_end,
            exit_margin: margin,
            // The energy that a stop lacks has a few roundings of its own, as in the scalar integrator.
            exit_margin_error: margin.map(|m| if through { bound } else { bound + 8.0 * f64::EPSILON * m.abs() }),
            cost: Cost {
                steps: crater_steps + tunnel_steps,
                rejected_steps: 0,
                force_evaluations: crater_steps * (CRATER_COEFFICIENTS - 1) + tunnel_steps * (COEFFICIENTS as u64 - 1),
            },
        })
    }
}

impl Work for Block {
    /// Solves a prepared block: all craters, then all tunnels.
    #[inline(always)]
    fn run(&mut self) {
        cross_craters(self);
        cross_tunnels(self);
    }
}

/// A time near an event, and the law there: `g t - g2 t²/2 - g3 t³/6 - g4 t⁴/24 = distance`.
#[derive(Clone, Copy)]
struct Approach {
    distance: f64,
    slope: f64,
    second: f64,
    third: f64,
    fourth: f64,
}

impl Approach {
    /// The time to the event, and whether it is exact to rounding.
    ///
    /// ```text
    /// t = e (1 + b + (2 b² + c) + (5 b³ + 5 b c + d) + ...),  e = distance/g,  b = g2 e/(2 g),  c = g3 e²/(6 g),  d = g4 e³/(24 g)
    /// ```
    #[inline(always)]
    fn solve(self) -> (f64, bool) {
        let inverse = 1.0 / self.slope;
        let e = self.distance * inverse;
        let b = 0.5 * self.second * (e * inverse);
        let c = (1.0 / 6.0) * self.third * (e * inverse) * e;
        let d = (1.0 / 24.0) * self.fourth * (e * inverse) * (e * e);
        let square = b * b + b * b + c;
        let time = e + e * (b + (square + (5.0 * b * (b * b + c) + d)));
        // The next term is 14 b⁴ + 21 b² c + 3 c² + 6 b d + (the quintic's own).
        let size = b * b + c.abs();
        let accepted = (time.abs() <= REACH) & (21.0 * (size * size) * self.distance.abs() <= f64::EPSILON);
        (time, accepted)
    }
}

/// Where a crater is left, in its units.
struct CraterEnd {
    time: f64,
    depth: f64,
    velocity: f64,
    status: f64,
}

/// The crater `u' = -y, y' = u, u(0) = 1, y(0) = 0` up to `y = limit`, or to `u = 0`.
///
/// The trial is a rough `asin(limit)`, good to 1e-5; from there [`Approach`] goes to the event.
#[inline(always)]
fn crater(limit: f64) -> CraterEnd {
    let passes = limit < 1.0;
    let goal = if passes { limit } else { 1.0 };
    // tan(t/2) = y/(1 + sqrt(1 - y²)), and a polynomial for the arc tangent (Hastings 1955, sheet 10 in kind).
    let tangent = goal / (1.0 + (1.0 - goal * goal).sqrt());
    let square = tangent * tangent;
    let trial = 2.0
        * tangent
        * (0.999_977_26
            + square
                * (-0.332_623_47
                    + square
                        * (0.193_543_46 + square * (-0.116_432_87 + square * (0.052_653_32 - square * 0.011_721_2)))));
    let t2 = trial * trial;
    let (mut u, mut y) = (0.0, 0.0);
    for j in (0..CRATER_TERMS).rev() {
        u = u * t2 + EVEN[j];
        y = y * t2 + ODD[j];
    }
    let y = y * trial;
    // y' = u, y'' = -y, y''' = -u, y'''' = y.
    let (t, accepted) = Approach { distance: goal - y, slope: u, second: y, third: u, fourth: -y }.solve();
    let velocity = u - t * (y + t * (0.5 * u - t * ((1.0 / 6.0) * y)));
    let clear = (limit - 1.0).abs() > TOUCH;
    CraterEnd {
        // Rest is at a quarter period and depth 1, whatever the limit.
        time: if passes { trial + t } else { FRAC_PI_2 },
        depth: goal,
        velocity: if passes { velocity } else { 0.0 },
        status: if !((accepted | !passes) & clear) {
            status::GIVEN_UP
        } else if passes {
            status::MOVING
        } else {
            status::REST
        },
    }
}

/// Terms of the two series: what follows is below 2e-17 up to the phase pi/2.
const CRATER_TERMS: usize = 11;

/// `(-1)^j/(2j)!`: coefficients of u in even powers of the phase.
const EVEN: [f64; CRATER_TERMS] = alternating_factorials(0);

/// `(-1)^j/(2j+1)!`: coefficients of y in odd powers of the phase.
const ODD: [f64; CRATER_TERMS] = alternating_factorials(1);

/// By the recurrence of the crater, `v[k+2] = -v[k]/((k+1)(k+2))`; the factorials up to 18! are exact in `f64`, the
/// quotients beyond rounded twice where they matter least.
const fn alternating_factorials(first: usize) -> [f64; CRATER_TERMS] {
    let mut table = [0.0; CRATER_TERMS];
    let (mut j, mut factorial) = (0, 1.0);
    while j < CRATER_TERMS {
        table[j] = if j % 2 == 0 { 1.0 / factorial } else { -1.0 / factorial };
        let k = 2 * j + first;
        factorial *= ((k + 1) * (k + 2)) as f64;
        j += 1;
    }
    table
}

#[inline(always)]
fn cross_craters(block: &mut Block) {
    // Whole vectors; what lies behind `count` is computed and forgotten.
    let count = block.count.next_multiple_of(WIDTH).min(BLOCK);
    for i in 0..count {
        let speed = block.impact_speed.0[i];
        let frequency = block.stiffness.0[i].sqrt();
        let limit = frequency * block.first_limit.0[i] / speed;
        let end = crater(limit);
        // Without a crater nothing has happened yet.
        let none = frequency == 0.0;
        let period = 1.0 / frequency;
        let time = if none { 0.0 } else { end.time * period };
        let velocity = speed * end.velocity;
        block.time.0[i] = time;
        block.crater_time.0[i] = time;
        block.velocity.0[i] = velocity;
        block.crater_velocity.0[i] = velocity;
        let passed = end.status == status::MOVING;
        block.depth.0[i] = if passed { block.first_limit.0[i] } else { speed * period };
        // As in the scalar integrator, in these units: greatest force and depth are the same number.
        block.bound.0[i] = f64::EPSILON * if none { 0.0 } else { 8.0 + 9.0 * end.depth * end.depth };
        let through = passed & (block.first_limit.0[i] >= block.exit_depth.0[i]);
        let ending = if through { status::EXIT } else { end.status };
        block.status.0[i] = if block.status.0[i] == status::MOVING { ending } else { status::GIVEN_UP };
    }
}

/// One scene in the tunnel.
#[derive(Clone, Copy)]
struct Lane {
    /// P/M and Q/M.
    static_force: f64,
    drag: f64,
    exit_depth: f64,
    /// 1/V0.
    per_impact_speed: f64,
    time: f64,
    depth: f64,
    velocity: f64,
    bound: f64,
    status: f64,
}

/// `log2 |x|` plus the exponent bias, 0 to 0.087 too small: exponent and significand read as one number.
#[inline(always)]
fn rough_log2(x: f64) -> f64 {
    // The upper bits become the significand of a number between 2^52 and 2^53: no conversion of integers.
    let upper = x.abs().to_bits() >> 12;
    (f64::from_bits(upper | TWO_52.to_bits()) - TWO_52) * (1.0 / (1_u64 << 40) as f64)
}

/// `2^y` times a factor from 0.94 to 1, for y from -1000 to 1000.
#[inline(always)]
fn rough_exp2(y: f64) -> f64 {
    let upper = (y + 1023.0) * (1_u64 << 40) as f64 + TWO_52;
    0.94 * f64::from_bits(upper.to_bits() << 12)
}

/// `2^52`: from here to its double, floats are the integers.
const TWO_52: f64 = (1_u64 << 52) as f64;

#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// One step of one lane in the tunnel; straight-line code, so that a loop over lanes becomes vector instructions.
#[inline(always)]
fn advance(lane: Lane) -> Lane {
    const K: usize = COEFFICIENTS;
    let rate = lane.static_force + lane.drag * lane.velocity * lane.velocity;
    let unit_time = lane.velocity / rate;
    let unit_depth = lane.velocity * unit_time;
    let beta = lane.drag * unit_depth;
    let alpha = lane.static_force * (unit_time / lane.velocity);
    let distance = (lane.exit_depth - lane.depth) / unit_depth;

    // The series: v of the velocity.
    let mut v = [0.0; K];
    v[0] = 1.0;
    v[1] = -1.0;
    let pull = -2.0 * beta;
    macro_rules! coefficients {
        ($($k:literal)*) => { $( if $k + 1 < K {
            let mut sum = if $k % 2 == 0 { 0.5 * v[$k / 2] * v[$k / 2] } else { 0.0 };
            // The newest coefficient comes last: the rest of the sum is ready before it is.
            let half: usize = ($k as usize).div_ceil(2);
            let mut i = half;
            while i > 1 {
                i -= 1;
                sum += v[i] * v[$k - i];
            }
            v[$k + 1] = (pull * (1.0 / ($k + 1) as f64)) * (sum + v[$k]);
        } )* };
    }
    coefficients!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30);

    // The step: the last two orders within a rounding unit.
    let goal = rough_log2(f64::EPSILON);
    let last = (goal - rough_log2(v[K - 1])) * (1.0 / (K - 1) as f64);
    let before = (goal - rough_log2(v[K - 2])) * (1.0 / (K - 2) as f64);
    let span = lesser(rough_exp2(lesser(last, before)), SPAN_MAX);

    // Guess of the time to rest, the series reverted; its terms are positive, so it never lies beyond rest.
    let to_rest = 1.0 + beta * (2.0 / 3.0 + beta * (8.0 / 15.0 + beta * (16.0 / 35.0 + beta * (128.0 / 315.0))));
    // Guess of the time to the exit: W there by its series over depth, then the trapezium rule with end corrections.
    let y = 2.0 * beta * distance;
    let energy = 1.0 - 2.0 * distance * (1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0)))));
    let exits = (distance <= span) & (energy > 0.0);
    let arrival = (if exits { energy } else { 1.0 }).sqrt();
    let mean = 2.0 * distance / (1.0 + arrival);
    let to_exit = mean * (1.0 + (1.0 / 6.0) * mean * beta * (1.0 - arrival));
    let guess = if exits { to_exit } else { to_rest };
    let lands = guess < span;
    let trial = if lands { guess } else { span };

    // Velocity and depth there, even and odd powers apart.
    let t2 = trial * trial;
    let (mut u_even, mut u_odd, mut x_even, mut x_odd) = (0.0, 0.0, 0.0, 0.0);
    for j in (0..K / 2).rev() {
        u_even = u_even * t2 + v[2 * j];
        u_odd = u_odd * t2 + v[2 * j + 1];
        x_even = x_even * t2 + v[2 * j] * (1.0 / (2 * j + 1) as f64);
        x_odd = x_odd * t2 + v[2 * j + 1] * (1.0 / (2 * j + 2) as f64);
    }
    let u = u_even + trial * u_odd;
    let x = trial * (x_even + trial * x_odd);

    // Derivatives by the law, and from there to the event.
    let u1 = -(alpha + beta * u * u);
    let u2 = pull * u * u1;
    let u3 = pull * (u1 * u1 + u * u2);
    let (t, accepted) = Approach {
        distance: if exits { distance - x } else { u },
        slope: if exits { u } else { -u1 },
        second: if exits { -u1 } else { u2 },
        third: if exits { -u2 } else { u3 },
        // The guess of rest, where it is used, is good to 2e-7: the fourth derivative moves nothing.
        fourth: if exits { -u3 } else { 0.0 },
    }
    .solve();
    let done = lands & accepted;
    let t = if done { t } else { 0.0 };
    let u_there = u + t * (u1 + t * (0.5 * u2 + t * ((1.0 / 6.0) * u3)));
    let x_there = x + t * (u + t * (0.5 * u1 + t * ((1.0 / 6.0) * u2 + t * ((1.0 / 24.0) * u3))));

    let velocity = lane.velocity * u_there;
    let reached = lane.depth + unit_depth * x_there;
    let depth = if done & exits { lane.exit_depth } else { reached };
    // The error bound of the scalar integrator, in these units: greatest velocity and force are 1.
    let relative = lane.velocity * lane.per_impact_speed;
    let force = rate * lane.per_impact_speed * lane.per_impact_speed;
    let added = relative * relative * (8.0 + 6.0 * x_there) + 3.0 * force * depth;
    let ending = if exits { status::EXIT } else { status::REST };
    let going = if velocity > 0.0 { status::MOVING } else { status::GIVEN_UP };
    Lane {
        time: lane.time + unit_time * (trial + t),
        depth,
        velocity,
        bound: lane.bound / exit_energy::exp_from_below(2.0 * beta * x_there) + f64::EPSILON * added,
        status: if done { ending } else { going },
        ..lane
    }
}

/// The lanes at work, in columns.
struct Lanes {
    lanes: [[f64; WIDTH]; 9],
    steps: [f64; WIDTH],
    /// Index in the block; none in an idle lane.
    scene: [Option<usize>; WIDTH],
}

impl Lanes {
    #[inline(always)]
    fn get(&self, i: usize) -> Lane {
        let [static_force, drag, exit_depth, per_impact_speed, time, depth, velocity, bound, status] = &self.lanes;
        Lane {
            static_force: static_force[i],
            drag: drag[i],
            exit_depth: exit_depth[i],
            per_impact_speed: per_impact_speed[i],
            time: time[i],
            depth: depth[i],
            velocity: velocity[i],
            bound: bound[i],
            status: status[i],
        }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, lane: Lane) {
        let [static_force, drag, exit_depth, per_impact_speed, time, depth, velocity, bound, status] = &mut self.lanes;
        static_force[i] = lane.static_force;
        drag[i] = lane.drag;
        exit_depth[i] = lane.exit_depth;
        per_impact_speed[i] = lane.per_impact_speed;
        time[i] = lane.time;
        depth[i] = lane.depth;
        velocity[i] = lane.velocity;
        bound[i] = lane.bound;
        status[i] = lane.status;
    }
}

/// What an idle lane solves: it never ends, and nothing reads it.
const IDLE: Lane = Lane {
    static_force: 1.0,
    drag: 0.0,
    exit_depth: f64::INFINITY,
    per_impact_speed: 1.0,
    time: 0.0,
    depth: 0.0,
    velocity: 1.0,
    bound: 0.0,
    status: status::MOVING,
};

#[inline(always)]
fn cross_tunnels(block: &mut Block) {
    let mut lanes = Lanes { lanes: [[0.0; WIDTH]; 9], steps: [0.0; WIDTH], scene: [None; WIDTH] };
    let mut next = 0;
    let mut moving = 0;
    for i in 0..WIDTH {
        moving += usize::from(refill(&mut lanes, i, block, &mut next));
    }
    // Every turn brings each lane one step on, and none takes more than STEPS_MAX.
    while moving > 0 {
        for i in 0..WIDTH {
            let lane = advance(lanes.get(i));
            lanes.put(i, lane);
        }
        for i in 0..WIDTH {
            lanes.steps[i] += 1.0;
        }
        for i in 0..WIDTH {
            let Some(scene) = lanes.scene[i] else { continue };
            let spent = lanes.steps[i] >= STEPS_MAX;
            let lane = lanes.get(i);
            if lane.status == status::MOVING && !spent {
                continue;
            }
            block.time.0[scene] = lane.time;
            block.depth.0[scene] = lane.depth;
            block.velocity.0[scene] = lane.velocity;
            block.bound.0[scene] = lane.bound;
            block.steps.0[scene] = lanes.steps[i];
            block.status.0[scene] = if lane.status == status::MOVING { status::GIVEN_UP } else { lane.status };
            moving -= usize::from(!refill(&mut lanes, i, block, &mut next));
        }
    }
}

/// Puts the next scene that has a tunnel to cross into lane `i`; false when there is none.
#[inline(always)]
fn refill(lanes: &mut Lanes, i: usize, block: &Block, next: &mut usize) -> bool {
    lanes.steps[i] = 0.0;
    while *next < block.count {
        let scene = *next;
        *next += 1;
        if block.status.0[scene] == status::MOVING {
            lanes.scene[i] = Some(scene);
            lanes.put(
                i,
                Lane {
                    static_force: block.static_force.0[scene],
                    drag: block.drag.0[scene],
                    exit_depth: block.exit_depth.0[scene],
                    per_impact_speed: 1.0 / block.impact_speed.0[scene],
                    time: block.time.0[scene],
                    depth: block.depth.0[scene],
                    velocity: block.velocity.0[scene],
                    bound: block.bound.0[scene],
                    status: status::MOVING,
                },
            );
            return true;
        }
    }
    lanes.scene[i] = None;
    lanes.put(i, IDLE);
    false
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests;
