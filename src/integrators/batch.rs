//! How are very many craters and tunnels flown at once? In lanes, by the Taylor series of [`super::taylor`].
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
//! derivatives, and the rest of the way is solved from them; otherwise the step was a step like any other.
//!
//! **What is not proven is not answered.** An exit margin within ten error bars of zero, a crater that all but stops the
//! projectile at k d, numbers of extreme magnitude, stages other than one crater and one tunnel: all these go
//! to the scalar [`Taylor`], whose answer is taken as it is.
//!
//! **Bit by bit.** A result depends on nothing but its scene: not on the neighbours, on the number of lanes, or on the
//! processor. Products and sums are never fused, divisions and roots are rounded correctly everywhere.

#![expect(
    clippy::cast_lossless,
    clippy::out_of_bounds_indexing,
    clippy::needless_bitwise_bool,
    clippy::struct_field_names,
    clippy::trivially_copy_pass_by_ref,
    reason = "one shape for every lane: unrolled coefficients behind a constant bound, and conditions without a branch"
)]

use std::f64::consts::FRAC_PI_2;

use super::outcome::{Cost, Detail, Flight, IntegrationError, Integrator};
use super::taylor::Taylor;
use crate::physics::{Event, EventKind, Outcome, Problem, State, Target, exit_energy};

/// Coefficients of the series in the tunnel. Work a unit of progress, `(K²/2 + 150)/eps^(1/(K-1))`, is least and flat
/// from 22 to 28.
const COEFFICIENTS: usize = 24;

/// Coefficients of V that the crater counts as evaluated: the constants of `u` and `y` up to the 21st power.
const CRATER_COEFFICIENTS: u64 = 22;

/// Scenes prepared at a time; some hundred kilobytes.
const BLOCK: usize = 1024;

/// Lanes in flight: two vectors of the widest kind.
const WIDTH: usize = 16;

/// Steps after which a lane is given to the scalar integrator. The widest drag of a sane scene takes forty.
const STEPS_MAX: f64 = 400.0;

/// Longest step in its own unit of time; rest without drag is at 1.
const SPAN_MAX: f64 = 64.0;

/// Longest last correction, in the unit of time: its neglected terms are of fifth order.
const REACH: f64 = 5e-4;

/// A crater that ends within this of the depth of rest, relatively, goes to the scalar integrator.
const TOUCH: f64 = 1e-4;

/// How many error bars an exit margin must be away from zero.
const BARS: f64 = 10.0;

/// Magnitudes that leave room for squares and quotients.
const SANE: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// How a flight went, without its events' list: what a table of results holds.
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
    /// Half-width of its error bar, as [`Flight::exit_margin_error`].
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
    /// The flight in full, for those who compare flights; events of a crater and a tunnel only.
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

/// What the processor offers for a loop over lanes. Results are the same bits on each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What every processor of this architecture has.
    Baseline,
    /// 256-bit vectors (x86-64).
    Avx2,
    /// 512-bit vectors (x86-64).
    Avx512,
}

impl Instructions {
    /// Every kind, narrow to wide.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// The widest that this processor has.
    pub fn detect() -> Self {
        Self::ALL.into_iter().rev().find(|kind| kind.is_available()).unwrap_or(Self::Baseline)
    }

    /// Whether this processor has them.
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

/// Flies many problems at once.
///
/// # Example
/// ```
/// use penetrode::integrators::batch::Batch;
/// use penetrode::physics::{Outcome, Problem, Stage, Target};
///
/// // Constant resistance: X = M V0²/(2 P).
/// let problem = Problem {
///     mass: 2.0,
///     impact_speed: 300.0,
///     exit_depth: f64::INFINITY,
///     stages: [Stage::tunnel(1.0e6, 0.0)].into_iter().collect(),
///     crater: None,
///     target: Target::CraterAndTunnel,
/// };
/// let flights = Batch::new().fly(&[problem.clone(), problem]);
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

    /// With `instructions`, to compare; `None` where the processor lacks them.
    pub fn with_instructions(instructions: Instructions) -> Option<Self> {
        instructions.is_available().then_some(Self { instructions })
    }

    /// Flies `problems`; answers come in their order, one each.
    ///
    /// The error of an answer is the one that [`Taylor`] gives for that problem; it stops no other.
    pub fn fly(&self, problems: &[Problem]) -> Vec<Result<Summary, IntegrationError>> {
        let mut answers = Vec::with_capacity(problems.len());
        let mut block = Block::default();
        for part in problems.chunks(BLOCK) {
            block.prepare(part);
            self.run(&mut block);
            for (index, problem) in part.iter().enumerate() {
                answers.push(match block.summary(index, problem) {
                    Some(summary) => Ok(summary),
                    None => Taylor::default().fly(problem, Detail::Events).map(|flight| Summary::from(&flight)),
                });
            }
        }
        answers
    }

    fn run(&self, block: &mut Block) {
        match self.instructions {
            Instructions::Baseline => fly_block(block),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the one thing that a function with `target_feature` asks for is a processor that has its features.
            // The field is private to this file, and here only `new` and `with_instructions` set it: `new` to what
            // `detect` found, `with_instructions` to what `is_available` allows; both ask the processor for every
            // feature that the function names, and no processor loses one. The argument is a reference and the
            // function returns nothing, so no vector crosses a border between calling conventions. The function
            // itself is safe code. CONTRIBUTING.md, "Tests", has the command that runs it under a sanitizer.
            Instructions::Avx512 => unsafe { fly_block_avx512(block) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above, for `Instructions::Avx2`.
            Instructions::Avx2 => unsafe { fly_block_avx2(block) },
            #[cfg(not(target_arch = "x86_64"))]
            _ => fly_block(block),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn fly_block_avx512(block: &mut Block) {
    fly_block(block);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fly_block_avx2(block: &mut Block) {
    fly_block(block);
}

/// How a scene stands. Kept as a number among the numbers, so that lanes need no other type.
mod status {
    /// Flying in the tunnel.
    pub(super) const FLYING: f64 = 0.0;
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
    /// Impact speed V0 [m/s].
    impact_speed: Column,
    /// c/M [1/s²].
    stiffness: Column,
    /// The first limit [m]: k d or the exit depth.
    first_limit: Column,
    /// Exit depth [m], infinite without one.
    exit_depth: Column,
    /// P/M [m/s²] and Q/M [1/m].
    static_force: Column,
    drag: Column,
    /// State reached: time [s], depth [m], velocity [m/s].
    time: Column,
    depth: Column,
    velocity: Column,
    /// State at k d: time [s] and velocity [m/s].
    crater_time: Column,
    crater_velocity: Column,
    /// Error bar of W/V0².
    bar: Column,
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
                ([first, ..], _) => (Some(first), first),
                // A problem has a stage; one without would be the scalar integrator's to refuse.
                ([], _) => {
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
            self.status.0[i] = if fits { status::FLYING } else { status::GIVEN_UP };
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
        let bar = self.bar.0[index];
        if margin.is_some_and(|m| !(m.abs() > BARS * bar) || (m > 0.0) != through) {
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
            // What a stop lacks is carried on with a few roundings of its own, as in the scalar integrator.
            exit_margin_error: margin.map(|m| if through { bar } else { bar + 8.0 * f64::EPSILON * m.abs() }),
            cost: Cost {
                steps: crater_steps + tunnel_steps,
                rejected_steps: 0,
                force_evaluations: crater_steps * (CRATER_COEFFICIENTS - 1) + tunnel_steps * (COEFFICIENTS as u64 - 1),
            },
        })
    }
}

/// Flies a prepared block: all craters, then all tunnels.
#[inline(always)]
fn fly_block(block: &mut Block) {
    cross_craters(block);
    cross_tunnels(block);
}

/// A time near an event, and the law there: `g t - g2 t²/2 - g3 t³/6 - g4 t⁴/24 = way`.
#[derive(Clone, Copy)]
struct Approach {
    way: f64,
    slope: f64,
    second: f64,
    third: f64,
    fourth: f64,
}

impl Approach {
    /// The time to the event, and whether it is exact to rounding.
    ///
    /// ```text
    /// t = e (1 + b + (2 b² + c) + (5 b³ + 5 b c + d) + ...),  e = way/g,  b = g2 e/(2 g),  c = g3 e²/(6 g),  d = g4 e³/(24 g)
    /// ```
    #[inline(always)]
    fn solve(self) -> (f64, bool) {
        let inverse = 1.0 / self.slope;
        let e = self.way * inverse;
        let b = 0.5 * self.second * (e * inverse);
        let c = (1.0 / 6.0) * self.third * (e * inverse) * e;
        let d = (1.0 / 24.0) * self.fourth * (e * inverse) * (e * e);
        let square = b * b + b * b + c;
        let time = e + e * (b + (square + (5.0 * b * (b * b + c) + d)));
        // The next term is 14 b⁴ + 21 b² c + 3 c² + 6 b d + (the quintic's own).
        let size = b * b + c.abs();
        let accepted = (time.abs() <= REACH) & (21.0 * (size * size) * self.way.abs() <= f64::EPSILON);
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
    let (t, accepted) = Approach { way: goal - y, slope: u, second: y, third: u, fourth: -y }.solve();
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
            status::FLYING
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
        let passed = end.status == status::FLYING;
        block.depth.0[i] = if passed { block.first_limit.0[i] } else { speed * period };
        // As in the scalar integrator, in these units: greatest force and depth are the same number.
        block.bar.0[i] = f64::EPSILON * if none { 0.0 } else { 8.0 + 9.0 * end.depth * end.depth };
        let through = passed & (block.first_limit.0[i] >= block.exit_depth.0[i]);
        let ending = if through { status::EXIT } else { end.status };
        block.status.0[i] = if block.status.0[i] == status::FLYING { ending } else { status::GIVEN_UP };
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
    bar: f64,
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
    let way = (lane.exit_depth - lane.depth) / unit_depth;

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
    let y = 2.0 * beta * way;
    let energy = 1.0 - 2.0 * way * (1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0)))));
    let exits = (way <= span) & (energy > 0.0);
    let arrival = (if exits { energy } else { 1.0 }).sqrt();
    let mean = 2.0 * way / (1.0 + arrival);
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
        way: if exits { way - x } else { u },
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
    // The bar of the scalar integrator, in these units: greatest velocity and force are 1.
    let relative = lane.velocity * lane.per_impact_speed;
    let force = rate * lane.per_impact_speed * lane.per_impact_speed;
    let added = relative * relative * (8.0 + 6.0 * x_there) + 3.0 * force * depth;
    let ending = if exits { status::EXIT } else { status::REST };
    let going = if velocity > 0.0 { status::FLYING } else { status::GIVEN_UP };
    Lane {
        time: lane.time + unit_time * (trial + t),
        depth,
        velocity,
        bar: lane.bar / exit_energy::exp_from_below(2.0 * beta * x_there) + f64::EPSILON * added,
        status: if done { ending } else { going },
        ..lane
    }
}

/// The lanes in flight, in columns.
struct Lanes {
    lanes: [[f64; WIDTH]; 9],
    steps: [f64; WIDTH],
    /// Index in the block; none in an idle lane.
    scene: [Option<usize>; WIDTH],
}

impl Lanes {
    #[inline(always)]
    fn get(&self, i: usize) -> Lane {
        let [static_force, drag, exit_depth, per_impact_speed, time, depth, velocity, bar, status] = &self.lanes;
        Lane {
            static_force: static_force[i],
            drag: drag[i],
            exit_depth: exit_depth[i],
            per_impact_speed: per_impact_speed[i],
            time: time[i],
            depth: depth[i],
            velocity: velocity[i],
            bar: bar[i],
            status: status[i],
        }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, lane: Lane) {
        let [static_force, drag, exit_depth, per_impact_speed, time, depth, velocity, bar, status] = &mut self.lanes;
        static_force[i] = lane.static_force;
        drag[i] = lane.drag;
        exit_depth[i] = lane.exit_depth;
        per_impact_speed[i] = lane.per_impact_speed;
        time[i] = lane.time;
        depth[i] = lane.depth;
        velocity[i] = lane.velocity;
        bar[i] = lane.bar;
        status[i] = lane.status;
    }
}

/// What an idle lane flies: it never ends, and nobody looks.
const IDLE: Lane = Lane {
    static_force: 1.0,
    drag: 0.0,
    exit_depth: f64::INFINITY,
    per_impact_speed: 1.0,
    time: 0.0,
    depth: 0.0,
    velocity: 1.0,
    bar: 0.0,
    status: status::FLYING,
};

#[inline(always)]
fn cross_tunnels(block: &mut Block) {
    let mut lanes = Lanes { lanes: [[0.0; WIDTH]; 9], steps: [0.0; WIDTH], scene: [None; WIDTH] };
    let mut next = 0;
    let mut flying = 0;
    for i in 0..WIDTH {
        flying += usize::from(refill(&mut lanes, i, block, &mut next));
    }
    // Every turn brings each lane one step on, and none takes more than STEPS_MAX.
    while flying > 0 {
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
            if lane.status == status::FLYING && !spent {
                continue;
            }
            block.time.0[scene] = lane.time;
            block.depth.0[scene] = lane.depth;
            block.velocity.0[scene] = lane.velocity;
            block.bar.0[scene] = lane.bar;
            block.steps.0[scene] = lanes.steps[i];
            block.status.0[scene] = if lane.status == status::FLYING { status::GIVEN_UP } else { lane.status };
            flying -= usize::from(!refill(&mut lanes, i, block, &mut next));
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
        if block.status.0[scene] == status::FLYING {
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
                    bar: block.bar.0[scene],
                    status: status::FLYING,
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
mod tests {
    use super::super::taylor::Series;
    use super::*;
    use crate::physics::Stage;
    use crate::physics::reference::{self, Exact, Source};

    fn scalar(problem: &Problem) -> Summary {
        Summary::from(&Taylor::default().fly(problem, Detail::Events).unwrap())
    }

    /// Random craters and tunnels; `decades` is how far their groups spread to either side, in powers of ten.
    fn problems(count: usize, decades: f64) -> Vec<Problem> {
        let mut random = fastrand::Rng::with_seed(1);
        let mut spread = |decades: f64| 10_f64.powf(decades * (2.0 * random.f64() - 1.0));
        let mut draw = || {
            let (mass, static_force, impact_speed) = (spread(3.0), 1e5 * spread(3.0), 100.0 * spread(2.0));
            // In units of M V0²/P, twice the depth of rest without drag.
            let rest = mass * impact_speed * impact_speed / static_force;
            let (depth, exit_depth) = (0.1 * rest * spread(0.5 * decades), 0.3 * rest * spread(0.5 * decades));
            let has_drag = spread(1.0) > 10_f64.powf(-0.8);
            let drag = if has_drag { static_force / impact_speed.powi(2) * spread(decades) } else { 0.0 };
            let force = static_force + drag * impact_speed * impact_speed;
            // Continuous, or within a factor 4 of it.
            let factor = spread(1.0);
            let stiffness =
                mass * force / (depth * (mass + depth * drag)) * if factor > 1.0 { 1.0 } else { spread(0.6) };
            let (has_crater, has_exit) = (spread(1.0) > 10_f64.powf(-0.8), spread(1.0) > 10_f64.powf(-0.4));
            let mut problem = Problem {
                mass,
                impact_speed,
                exit_depth: if has_exit { exit_depth } else { f64::INFINITY },
                stages: [Stage::tunnel(static_force, drag)].into_iter().collect(),
                crater: None,
                target: Target::CraterAndTunnel,
            };
            if has_crater {
                problem.stages.insert(0, Stage::crater(stiffness, depth));
                problem.crater = Some(0);
            }
            problem
        };
        (0..count).map(|_| draw()).collect()
    }

    #[test]
    fn every_processor_and_any_neighbours_give_the_same_bits() {
        // Miri is slow: as many as fill the lanes twice.
        let count = if cfg!(miri) { 2 * WIDTH } else { 1500 };
        let problems: Vec<Problem> = problems(count, 2.0).into_iter().chain(problems(count, 9.0)).collect();
        let whole = Batch::new().fly(&problems);
        for batch in Instructions::ALL.into_iter().filter_map(Batch::with_instructions) {
            assert_eq!(batch.fly(&problems), whole, "{batch:?}");
        }
        for (problem, together) in problems.iter().zip(&whole).step_by(7) {
            assert_eq!(Batch::new().fly(std::slice::from_ref(problem))[0], *together);
        }
        let backwards: Vec<Problem> = problems.iter().rev().cloned().collect();
        assert!(Batch::new().fly(&backwards).into_iter().rev().eq(whole));
    }

    #[test]
    fn nearly_all_scenes_are_answered_by_the_lanes_themselves() {
        let problems = problems(1500, 2.0);
        let given_up =
            problems.iter().zip(Batch::new().fly(&problems)).filter(|(p, f)| scalar(p) == *f.as_ref().unwrap()).count();
        assert!(given_up <= 15, "{given_up} of 1500");
    }

    #[test]
    fn lanes_agree_with_the_scalar_integrator_over_eighteen_orders_of_drag() {
        let problems = problems(4000, 9.0);
        for (problem, flight) in problems.iter().zip(Batch::new().fly(&problems)) {
            let (lane, alone) = (flight.unwrap(), scalar(problem));
            assert_eq!((lane.outcome, lane.stage), (alone.outcome, alone.stage), "{problem:?}\n{lane:?}\n{alone:?}");
            let depth = (lane.end.depth / alone.end.depth - 1.0).abs();
            assert!(depth <= 1e-14, "{depth} {problem:?}");
            assert_eq!(lane.crater_end.is_some(), alone.crater_end.is_some(), "{problem:?}");
            // Velocities by the energy they stand for, which is well conditioned.
            let energy = (lane.end.velocity.powi(2) - alone.end.velocity.powi(2)).abs() / problem.impact_speed.powi(2);
            assert!(energy <= 2e-14, "{energy} {problem:?}");
        }
    }

    #[test]
    fn the_bar_holds_the_error_of_the_margin() {
        let problems: Vec<Problem> = problems(300, 2.0).into_iter().chain(problems(300, 9.0)).collect();
        let mut judged = 0;
        for (problem, flight) in problems.iter().zip(Batch::new().fly(&problems)) {
            let flight = flight.unwrap();
            let Some((margin, bar)) = flight.exit_margin.zip(flight.exit_margin_error) else { continue };
            let exact = reference::flight(Source::Problem(problem)).unwrap().exit_margin.unwrap();
            let error = exact.error_over(margin, &Exact::one());
            assert!(error <= bar, "{error} {bar} {margin} {problem:?}");
            judged += 1;
        }
        assert!(judged > 300, "{judged}");
    }

    #[test]
    fn what_the_lanes_cannot_prove_is_the_scalar_integrators_answer() {
        let crater_and_tunnel = |impact_speed: f64, exit_depth: f64, stiffness: f64| Problem {
            mass: 2.0,
            impact_speed,
            exit_depth,
            stages: [Stage::crater(stiffness, 0.1), Stage::tunnel(8.5e5, 3.25)].into_iter().collect(),
            crater: Some(0),
            target: Target::CraterAndTunnel,
        };
        // V1 = 0 at k d, exactly and nearly.
        let touching = 2.0 * 300.0 * 300.0 / 0.01;
        let graze = scalar(&crater_and_tunnel(300.0, f64::INFINITY, 8.5e6)).end.depth;
        let mut stages = crater_and_tunnel(300.0, 1.0, 8.5e6);
        stages.target = Target::Stages;
        let mut viscous = crater_and_tunnel(300.0, 1.0, 8.5e6);
        viscous.stages[1].viscosity = 1.0;
        let with_crater = |crater: Stage| {
            let mut problem = crater_and_tunnel(300.0, 1.0, 8.5e6);
            problem.stages[0] = crater;
            problem
        };
        let crater = Stage::crater(8.5e6, 0.1);
        for problem in [
            with_crater(Stage { static_force: 1e4, ..crater }),
            with_crater(Stage { viscosity: 1e2, ..crater }),
            with_crater(Stage { drag: 1.0, ..crater }),
            with_crater(Stage { stiffness: 1e60, ..crater }),
            with_crater(Stage { end: 1e-60, ..crater }),
            crater_and_tunnel(300.0, graze, 8.5e6),
            crater_and_tunnel(300.0, f64::INFINITY, touching),
            crater_and_tunnel(300.0, f64::INFINITY, touching * (1.0 + 1e-9)),
            crater_and_tunnel(0.0, 1.0, 8.5e6),
            crater_and_tunnel(300.0, 0.0, 8.5e6),
            crater_and_tunnel(1e-160, f64::INFINITY, 8.5e6),
            stages,
            viscous,
        ] {
            assert_eq!(Batch::new().fly(std::slice::from_ref(&problem))[0], Ok(scalar(&problem)), "{problem:?}");
        }
    }

    #[test]
    fn an_exit_at_the_end_of_the_crater_is_both_events() {
        let problem = Problem {
            mass: 2.0,
            impact_speed: 300.0,
            exit_depth: 0.1,
            stages: [Stage::crater(8.5e6, 0.1), Stage::tunnel(8.5e5, 3.25)].into_iter().collect(),
            crater: Some(0),
            target: Target::CraterAndTunnel,
        };
        let flight = Batch::new().fly(std::slice::from_ref(&problem))[0].clone().unwrap();
        assert_eq!((flight.outcome, flight.stage), (Outcome::Perforated, 0));
        assert_eq!(flight.crater_end, Some(flight.end));
        assert_eq!(scalar(&problem).crater_end.map(|s| s.depth), Some(0.1));
        assert_eq!(scalar(&problem).stage, 0);
    }

    #[test]
    fn an_endless_flight_is_the_error_of_its_own_row_only() {
        let mut problems = problems(3, 2.0);
        // Drag alone never brings anything to rest.
        problems[1].stages = [Stage::tunnel(0.0, 1.0)].into_iter().collect();
        problems[1].crater = None;
        problems[1].exit_depth = f64::INFINITY;
        let flights = Batch::new().fly(&problems);
        assert!(matches!(flights[1], Err(IntegrationError::NeverEnds { .. })), "{:?}", flights[1]);
        assert!(flights[0].is_ok() && flights[2].is_ok());
    }

    /// M = 2, V0 = 1, P + Q = 2: `beta` is the share of the drag, `way` the exit depth over V0²/(P + Q V0²), all exact.
    fn tunnel(beta: f64, way: f64) -> Problem {
        Problem {
            mass: 2.0,
            impact_speed: 1.0,
            exit_depth: way,
            stages: [Stage::tunnel(2.0 - 2.0 * beta, 2.0 * beta)].into_iter().collect(),
            crater: None,
            target: Target::CraterAndTunnel,
        }
    }

    /// V0 = 1, c/M = 1: the crater ends at `limit`, in its own units.
    fn crater_of(limit: f64, exit_depth: f64) -> Problem {
        let mut problem = tunnel(0.0, exit_depth);
        problem.stages.insert(0, Stage::crater(2.0, limit));
        problem.crater = Some(0);
        problem
    }

    /// Greatest errors in rounding units, against 50 digits: of the time (where it is known only as well as the depth,
    /// over V/V0), of the depth, and of V²/V0²; at the end and at the end of the crater.
    fn roundings(problems: &[Problem]) -> [f64; 5] {
        let mut worst = [0.0_f64; 5];
        for (problem, flight) in problems.iter().zip(Batch::new().fly(problems)) {
            let flight = flight.unwrap();
            let exact = reference::flight(Source::Problem(problem)).unwrap();
            assert_eq!((flight.outcome, flight.stage), (exact.outcome, exact.stage), "{problem:?}");
            let of = |state: &State, exact_state: &reference::ExactState| {
                let share = state.velocity / problem.impact_speed;
                [
                    exact_state.time.relative_error(state.time) * if share > 0.0 { share } else { 1.0 },
                    2.0 * share * exact_state.velocity.error_over(state.velocity, &exact.impact_speed),
                ]
            };
            let [time, energy] = of(&flight.end, &exact.end);
            let depth = exact.end.depth.relative_error(flight.end.depth);
            assert_eq!(flight.crater_end.is_some(), exact.crater_end().is_some(), "{problem:?}");
            let [crater_time, crater_energy] =
                flight.crater_end.zip(exact.crater_end()).map_or([0.0; 2], |(state, exact)| of(&state, exact));
            for (worst, error) in worst.iter_mut().zip([time, depth, energy, crater_time, crater_energy]) {
                *worst = worst.max(error / f64::EPSILON);
            }
        }
        worst
    }

    fn assert_within(worst: [f64; 5], limits: [f64; 5]) {
        assert!(worst.iter().zip(limits).all(|(&worst, limit)| worst <= limit), "{worst:?} of {limits:?}");
    }

    #[test]
    fn every_tunnel_ends_within_two_roundings_of_fifty_digits() {
        // In one step up to a share of 0.055, or through the exit; in several beyond.
        let shares = (0..16).map(|j| f64::from(j) / 256.0).chain((2..32).map(|j| f64::from(j) / 32.0));
        let ways = [f64::INFINITY, 0.0625, 0.1875, 0.25, 0.3125, 0.375, 0.4375, 0.468_75, 0.515_625, 0.5625];
        let tunnels: Vec<Problem> = shares.flat_map(|beta| ways.map(|way| tunnel(beta, way))).collect();
        assert_within(roundings(&tunnels), [1.5, 1.7, 2.0, 0.0, 0.0]);
    }

    #[test]
    fn every_crater_ends_within_two_roundings_of_fifty_digits() {
        // Denser where the trial is poor and V still great.
        let limits = (1..=120).map(|i| f64::from(i) / 113.5).chain((0..40).map(|i| 0.58 + f64::from(i) / 800.0));
        let craters: Vec<Problem> =
            limits.flat_map(|limit| [0.25, f64::INFINITY].map(|exit| crater_of(limit, exit))).collect();
        assert_within(roundings(&craters), [1.5, 1.5, 1.6, 1.5, 1.6]);
    }

    #[test]
    fn craters_and_tunnels_in_any_units_end_within_few_roundings_of_fifty_digits() {
        assert_within(roundings(&problems(300, 2.0)), [3.5, 4.5, 2.5, 2.5, 3.0]);
    }

    #[test]
    fn the_bar_is_that_of_the_scalar_integrator_where_both_take_one_step_a_stage() {
        let mut problems = problems(1000, 2.0);
        problems.retain(Problem::has_exit);
        // Where the guess of the exit is poorest.
        problems.extend((0..24).flat_map(|j| [0.4, 0.44, 0.47].map(|way| tunnel(f64::from(j) / 256.0, way))));
        let (mut judged, mut worst) = ([0; 4], [0.0_f64; 4]);
        for (problem, flight) in problems.iter().zip(Batch::new().fly(&problems)) {
            let (lane, alone) = (flight.unwrap(), scalar(problem));
            let crater = problem.crater.is_some();
            if alone.cost.steps > 1 + lane.stage as u64 || lane == alone {
                continue;
            }
            let (bar, expected) = (lane.exit_margin_error.unwrap(), alone.exit_margin_error.unwrap());
            let kind = usize::from(crater) + 2 * lane.stage;
            worst[kind] = worst[kind].max((bar / expected - 1.0).abs());
            judged[kind] += 1;
        }
        // Tunnel alone, crater only, crater and tunnel.
        assert!(judged[0] > 30 && judged[1] > 200 && judged[3] > 150, "{judged:?}");
        assert!(worst.iter().all(|&worst| worst < 2e-14), "{worst:?}");
    }

    #[test]
    fn a_margin_of_ten_bars_is_not_yet_proven() {
        let problem = tunnel(0.25, 0.125);
        let mut block = Block::default();
        block.prepare(std::slice::from_ref(&problem));
        block.status.0[0] = status::EXIT;
        block.velocity.0[0] = 1.0;
        for (bar, proven) in [(0.1, false), (0.1_f64.next_down(), true)] {
            block.bar.0[0] = bar;
            assert_eq!(block.summary(0, &problem).is_some(), proven, "{bar}");
        }
    }

    #[test]
    fn work_is_a_crater_and_the_steps_of_the_tunnel() {
        // 21 for a crater, 23 for a step in the tunnel: stopped in each, and through each.
        for (problem, steps, force_evaluations) in [
            (crater_of(2.0, f64::INFINITY), 1, 21),
            (crater_of(0.5, f64::INFINITY), 2, 44),
            (crater_of(0.5, 0.25), 1, 21),
            (crater_of(0.5, 0.625), 2, 44),
            (tunnel(0.0, f64::INFINITY), 1, 23),
            (tunnel(0.0, 0.125), 1, 23),
        ] {
            let flight = Batch::new().fly(std::slice::from_ref(&problem))[0].clone();
            assert_eq!(flight.map(|f| f.cost), Ok(Cost { steps, rejected_steps: 0, force_evaluations }), "{problem:?}");
        }
    }

    /// The events again, but for rest and exit at one place.
    #[test]
    fn a_summary_gives_the_flight_back() {
        let graze = scalar(&tunnel(0.5, f64::INFINITY)).end.depth;
        let mut kinds = Vec::new();
        for problem in [
            crater_of(2.0, 3.0),
            crater_of(0.5, f64::INFINITY),
            crater_of(0.5, 0.25),
            crater_of(0.5, 0.625),
            tunnel(0.5, graze * (1.0 - 1e-15)),
            tunnel(0.5, graze * (1.0 + 1e-15)),
        ] {
            let flight = Taylor::default().fly(&problem, Detail::Events).unwrap();
            assert_eq!(Summary::from(&flight).flight(), flight);
            kinds.push((flight.outcome, flight.events.last().unwrap().kind));
        }
        assert_eq!(kinds[4..], [(Outcome::Undecided, EventKind::Exit), (Outcome::Undecided, EventKind::Rest)]);
    }

    #[test]
    fn a_batch_flies_with_the_instructions_it_was_given() {
        assert!(Instructions::Baseline.is_available());
        for kind in Instructions::ALL {
            let batch = Batch::with_instructions(kind);
            assert_eq!(batch.map(|b| b.instructions), kind.is_available().then_some(kind));
            assert!(kind <= Instructions::detect() || batch.is_none());
        }
        assert_eq!(Batch::new().instructions, Instructions::detect());
    }

    /// From a time and a law follow `e`, `b`, `c` and `d`; they give the time back but for the terms left out.
    #[test]
    fn an_approach_finds_the_time_up_to_the_order_that_it_names() {
        for t in [0.02, -0.01, 3e-4] {
            for (slope, second, third, fourth) in
                [0.8, 1.25].into_iter().flat_map(|g| [-1.5, 0.0, 2.0].map(|g2| (g, g2))).flat_map(|(g, g2)| {
                    [-30.0, 0.0, 20.0].into_iter().flat_map(move |g3| [-900.0, 0.0, 700.0].map(|g4| (g, g2, g3, g4)))
                })
            {
                let way = t * (slope - t * (second / 2.0 + t * (third / 6.0 + t * fourth / 24.0)));
                let (time, _) = Approach { way, slope, second, third, fourth }.solve();
                let b: f64 = second * t / 2.0 / slope;
                let c: f64 = third * t * t / 6.0 / slope;
                let d: f64 = fourth * t * t * t / 24.0 / slope;
                let left_out =
                    14.0 * b.powi(4) + 21.0 * b * b * c.abs() + 3.0 * c * c + 6.0 * (b * d).abs() + 10.0 * d * d;
                let error = (time / t - 1.0).abs();
                assert!(
                    error <= 1.5 * left_out + 4.0 * f64::EPSILON,
                    "{t} {slope} {second} {third} {fourth}: {error:e} {left_out:e}"
                );
            }
        }
    }

    #[test]
    fn an_approach_is_accepted_only_where_it_meets_the_event_and_is_short() {
        let mut accepted = 0;
        for way_in_time in [-4e-4, -1e-6, 1e-9, 3e-5, 4e-4] {
            for slope in [1.0, 0.02] {
                for b in [0.0, 1e-4, 0.01, 0.2] {
                    for c in [-0.04, -1e-4, 0.0, 1e-8, 1e-4, 0.04] {
                        let e: f64 = way_in_time;
                        let approach = Approach {
                            way: slope * e,
                            slope,
                            second: 2.0 * b * slope / e,
                            third: 6.0 * c * slope / (e * e),
                            fourth: 0.0,
                        };
                        let (t, is_met) = approach.solve();
                        let Approach { way, second, third, .. } = approach;
                        let missed = (t * (slope - t * (second / 2.0 + t * third / 6.0)) - way).abs();
                        assert!(
                            !is_met || missed <= f64::EPSILON,
                            "{missed:e} after {t:e}: e = {e:e}, g = {slope}, b = {b}, c = {c}"
                        );
                        accepted += i32::from(is_met);
                    }
                }
            }
        }
        assert!(accepted > 50, "{accepted} of 240");
        let straight = |way| Approach { way, slope: 1.0, second: 0.0, third: 0.0, fourth: 0.0 }.solve();
        assert_eq!(straight(REACH), (REACH, true));
        assert_eq!(straight(-REACH.next_up()), (-REACH.next_up(), false));
    }

    #[test]
    fn rough_powers_and_logarithms_keep_their_bounds() {
        for j in 0..=3200 {
            let y = f64::from(j - 1600) / 16.0 * 9.9;
            let factor = rough_exp2(y) / y.exp2();
            assert!((0.94 - 1e-11..=1.0).contains(&factor), "2^{y}: {factor}");
            let x = y.exp2();
            let off = rough_log2(-x) - 1023.0 - y;
            assert!((-0.0861..=1e-11).contains(&off), "log2 of 2^{y}: {off}");
        }
    }

    /// A step that no event cuts short is as long as that of the scalar integrator with as many coefficients.
    #[test]
    fn a_step_in_the_tunnel_is_as_long_as_the_last_two_orders_allow() {
        for j in 8..=128 {
            let beta = f64::from(j) / 128.0;
            let law = Stage::tunnel(1.0 - beta, beta);
            let series = Series::<f64, COEFFICIENTS>::new::<false, true, true>(&law, 1.0);
            let lane = Lane { static_force: 1.0 - beta, drag: beta, ..IDLE };
            let reached = advance(lane);
            let span = series.span(f64::EPSILON);
            assert!((reached.time / span - 1.0).abs() < 1e-11, "{beta}: {} {span}", reached.time);
        }
    }

    #[test]
    fn the_tables_of_the_crater_are_the_reciprocals_of_factorials_with_signs_in_turn() {
        for (table, first) in [(EVEN, 0), (ODD, 1)] {
            for (j, entry) in (0_u128..).zip(table) {
                let factorial = (1..=2 * j + first).product::<u128>() as f64;
                let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
                assert!((entry * factorial - sign).abs() <= f64::EPSILON, "{j}, {first}: {entry}");
            }
        }
    }
}
