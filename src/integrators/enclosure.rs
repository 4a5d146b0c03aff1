//! Between which two numbers does the exact answer lie? Taylor series whose errors are bounded by a proof.
//!
//! A step is taken with numbers, not with intervals: polynomials `x(t)` and `v(t)`, the first coefficients as double words,
//! the others as `f64`. What they miss of the equation of motion is their defect, and it is bounded term by term:
//!
//! ```text
//! dx = x' - v,   dv = v' + (p + s x + r v + q v²)/M      rounding of the low orders, truncation above order K
//! N' <= |dv| + w |dx|,   N = sqrt(ev² + w² ex²),  w² = s/M     for s, r, q >= 0 while V >= 0 and v >= 0
//! N' <= w N + |dv| + w |dx|,   N = |ev| + w |ex|,  w² = -s/M   for s < 0, r = q = 0
//! ```
//!
//! Resistance never lets the error N of a flight grow, so that no interval is ever wrapped in another. The last few
//! digits of a step to an event are a mean value over a tiny box, by which the event also is proved to be the first.
//!
//! docs/enclosures.md has the proof, inequality by inequality.

mod ending;
mod law;

use smallvec::SmallVec;

use ending::Ending;
use law::{Expression, Misses};

use super::flight::{self, Bounded, Course, StageEnd, StageSolver};
use super::outcome::{Cost, Detail, Flight, IntegrationError, Integrator, Solved};
use super::taylor::power_of_two_below;
use crate::physics::ball::{Ball, DoubleWord, TINY, UNIT, UP};
use crate::physics::condition::Condition;
use crate::physics::force_table::{Piece, SpeedTable};
use crate::physics::law::Law as OwnLaw;
use crate::physics::scalar::reciprocal;
use crate::physics::{Outcome, Problem, Scalar, Stage, State};

/// Order K: v has the powers 0 to K, and x one more.
const ORDER: usize = 24;

/// Coefficients below this index are double words.
const FINE: usize = 8;

/// Truncation error of a step over the velocity at its start: far below the spacing of `f64`.
const TRUNCATION: f64 = 1.0 / (1_u128 << 70) as f64;

/// Unit roundoff of `f64`, 2^-53.
const ROUNDOFF: f64 = 0.5 * f64::EPSILON;

/// Longest step over the shortest time scale of its stage.
const SPAN_MAX: f64 = 16.0;

/// Largest `w h` of a step, short of the half period in which V could vanish twice.
const PHASE_MAX: f64 = 1.8;

/// Largest `w h` of a step through a falling force, for which `e^y <= 1 + y + y²`.
const GROWTH_MAX: f64 = 1.0;

/// Panels into which a step is divided to prove that V does not vanish inside.
const PANELS_MAX: u32 = 200;

/// Shorter steps tried where a proof fails.
const RETRIES_MAX: u32 = 8;

/// Steps allowed for one flight.
const STEPS_MAX: u64 = 100_000;

/// Steps allowed for a stage with an expression, which take longer: a force may vanish with the velocity.
const OWN_STEPS_MAX: u64 = 5_000;

/// Velocity over that at impact at which nothing more is proved of a stage with an expression: its steps only grow shorter.
const STILL: f64 = 1e-20;

/// Velocity over that at the start of a step, below which a passage is sought in double words.
const SLOW: f64 = 1e-3;

/// Least and greatest magnitude of a number for which a bound was derived (docs/enclosures.md, section 2).
const MAGNITUDES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

/// What is said of a flight whose end no proof was found for.
pub(crate) const UNPROVED: &str =
    "no proof was found of how the flight ends; the interval holds every end that is left open";

/// The enclosure: exact answers between two numbers.
///
/// [`Enclosure::enclose`] gives the intervals, of problems whose numbers are intervals, in the units of the problem (SI). As an
/// [`Integrator`] it takes the numbers of the problem for exact and gives the middle of each interval, rounded. The
/// proof is docs/enclosures.md.
///
/// # Example
/// ```
/// use penetrode::integrators::{Detail, Enclosure};
/// use penetrode::physics::{Problem, Stage, Scalar, ball::Ball};
///
/// // Constant resistance: X = M V0²/(2 P) = 0.09 m, which is no f64.
/// let problem = Problem::crater_and_tunnel(2.0, 300.0, None, Stage::tunnel(1.0e6, 0.0));
/// let flight = Enclosure.enclose(&problem.cast(), Detail::Events)?;
/// let (low, high) = flight.end.depth.interval();
/// assert!(low <= 0.09 && 0.09 <= high && high - low < 3e-17);
/// # Ok::<(), penetrode::integrators::IntegrationError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Enclosure;

impl Enclosure {
    /// Encloses the flight of `problem`, whatever numbers of its balls are meant.
    ///
    /// The outcome is proved, or `Undecided`. Two boundaries of the problem are the same ball or differ as `f64`.
    ///
    /// # Errors
    /// [`IntegrationError::Refused`] for a law in code, numbers beyond 1e-100 to 1e100, or depths, conditions or velocities of a
    /// table that differ, and not as `f64`; [`IntegrationError::NeverEnds`].
    pub fn enclose(&self, problem: &Problem<Ball>, detail: Detail) -> Solved<Flight<Ball>> {
        let is_known = |law: &OwnLaw<Ball>| law.bound().is_some() || law.table().is_some();
        if !(0..problem.stages.len()).all(|index| problem.laws.of(index).is_none_or(is_known)) {
            return Err(refuse("nothing is proved of a force in code; take --method taylor"));
        }
        let depths = problem.stages.iter().map(|stage| stage.end).chain([problem.exit_depth]);
        if !depths.chain([problem.mass, problem.impact_speed]).all(is_in_range) {
            return Err(out_of_range());
        }
        if !boundaries_are_apart(problem) {
            return Err(refuse(
                "two of its depths differ, and not as 64-bit numbers: which comes first is not known; make them equal, or \
                 move one by 1e-15 of itself",
            ));
        }
        if !conditions_are_apart(problem) {
            return Err(refuse("two of its conditions differ, and not as 64-bit numbers; make them equal"));
        }
        if !ends_are_apart_from_rows(problem) {
            return Err(refuse(
                "the velocity at which a stage ends and one of its table differ, and not as 64-bit numbers; make them equal",
            ));
        }
        let mut steps = Steps::default();
        let mut flight = flight::solve(problem, detail, &mut steps)?;
        if let Some(open) = steps.open {
            // What was listed for the end is not proved.
            let end = flight.end;
            flight.events.retain(|event| event.state != end);
            (flight.outcome, flight.end) = (Outcome::Undecided, open);
        } else if flight.outcome == Outcome::Undecided {
            // Proved, however wide its margin is.
            let is_stop = flight.end.velocity.is_zero();
            flight.outcome = if is_stop { problem.stop_in(flight.stage) } else { Outcome::Perforated };
        }
        Ok(flight)
    }
}

/// Whether bounds are derived for numbers of this size: none, or infinite, or in [`MAGNITUDES`].
fn is_in_range(number: Ball) -> bool {
    let size = number.value().abs();
    size == 0.0 || size == f64::INFINITY || MAGNITUDES.contains(&size)
}

fn refuse(why: &str) -> IntegrationError {
    IntegrationError::Refused { method: "enclosure", why: why.to_owned() }
}

fn out_of_range() -> IntegrationError {
    refuse("its bounds are derived for numbers from 1e-100 to 1e100 in SI units; take --method taylor")
}

/// Whether everything in `depth` lies in front of `limit`, which is infinite where rest alone can end a stage.
fn is_before(depth: Ball, limit: Ball) -> bool {
    limit.value() == f64::INFINITY || depth.upper() < limit.lower()
}

/// Whether any two ends, and the exit, are the same ball or differ as `f64` and as balls.
fn boundaries_are_apart(problem: &Problem<Ball>) -> bool {
    // A stage that ends on a condition may have no end at a depth.
    let ends = problem.stages.iter().map(|stage| stage.end).filter(|end| end.value() < f64::INFINITY);
    let ends: Vec<Ball> = ends.chain([problem.exit_depth]).collect();
    let is_told =
        |a: Ball, b: Ball| a == b || (a.value() < b.value() && a.upper() <= b.lower()) || b.value() == f64::INFINITY;
    let [inner @ .., exit] = ends.as_slice() else { return true };
    inner.windows(2).all(|pair| is_told(pair[0], pair[1]))
        && inner.iter().all(|end| is_told(*end, *exit) || is_told(*exit, *end))
        && inner.iter().all(|end| is_told(Ball::zero(), *end))
}

/// Whether a ball is no wider than a decimal makes it, which is a quotient of two whole numbers.
fn is_decimal(number: Ball) -> bool {
    number.radius <= 8.0 * UNIT * number.magnitude()
}

/// Whether each condition that is taken for the one before it has the same numbers: the same balls, no wider than decimals make them.
fn conditions_are_apart(problem: &Problem<Ball>) -> bool {
    let end_of = |index: usize| problem.laws.of(index).and_then(|law| law.end());
    let conditions = (0..problem.stages.len()).filter_map(end_of);
    conditions.clone().all(|condition| {
        let next = end_of(condition.next()).filter(|next| next.is_same(condition));
        next.is_none_or(|next| {
            // Parameters of an equation are those of the scene, and are the same whatever they are.
            let is_known = !condition.is_speed() || condition.parameters().iter().copied().all(is_decimal);
            is_known && next.parameters() == condition.parameters()
        })
    })
}

/// Whether each speed that ends a stage with a table of velocity is the same ball as the velocity of a row, or differs as `f64`.
fn ends_are_apart_from_rows(problem: &Problem<Ball>) -> bool {
    (0..problem.stages.len()).filter_map(|index| problem.laws.of(index)).all(|law| {
        let (Some(table), Some(end)) = (law.table(), law.end().and_then(Condition::speed)) else { return true };
        table.rows().iter().map(|row| Ball::decimal(row.at)).all(|row| row == end || row.value() != end.value())
    })
}

/// Whether `velocity` is proved to lie on the piece of `table` that its middle lies on, and to change as it does there.
fn is_on_piece(table: &SpeedTable, velocity: Ball) -> bool {
    let Some(Piece { index, rises }) = table.piece(velocity.value()) else { return false };
    let [low, high] = [index, index + 1].map(|row| Ball::decimal(table.rows()[row].at));
    let [force, slope, start] = table.line::<Ball>(index);
    let force = force + slope * (velocity - start);
    let is = |row: Ball| velocity == row && is_decimal(velocity);
    let is_within = (is(low) || velocity.lower() >= low.upper()) && (is(high) || velocity.upper() <= high.lower());
    is_within && if rises { force.upper() < 0.0 } else { force.lower() >= 0.0 }
}

impl Integrator for Enclosure {
    fn name(&self) -> &'static str {
        "enclosure"
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        self.enclose(&problem.cast(), detail).map(|flight| flight.values())
    }

    fn explain(&self, _problem: &Problem, flight: &Flight) -> Vec<String> {
        vec![format!("{} steps of a series of order {ORDER}, each with a proved bound of its error", flight.cost.steps)]
    }
}

/// The method, as the loop sees it.
#[derive(Debug, Default)]
struct Steps {
    /// Where the flight ends, if how it ends is open.
    open: Option<State<Ball>>,
}

/// The error of a state in the present stage, in m/s and m: N, and bounds of |ev| and |ex| alone.
#[derive(Clone, Copy, Debug)]
struct Error {
    norm: f64,
    velocity: f64,
    depth: f64,
}

/// The law of a stage over the mass, and what its proofs need of it.
enum Law<'a> {
    /// p, s, r and q.
    Coefficients(Coefficients),
    /// An expression.
    Expression(Expression<'a>),
}

impl<'a> Law<'a> {
    /// The `own` law of a `stage`, or that of its coefficients, for the `mass` that moves there from a state; `None` where no bound is
    /// derived for it, or its condition may be met there.
    fn new(stage: &Stage<Ball>, own: Option<&'a OwnLaw<Ball>>, mass: Ball, at: State<Ball>) -> Option<Self> {
        let Some(law) = own else { return Coefficients::new(stage, mass).map(Self::Coefficients) };
        let ending = match law.end() {
            Some(condition) => Some(Box::new(Ending::new(condition, at)?)),
            None => None,
        };
        Some(Self::Expression(Expression::new(law.bound()?, mass, ending)))
    }

    /// Whether no condition ends the stage at any depth in `x` and velocity in `v`.
    fn is_open(&self, x: Ball, v: Ball) -> bool {
        match self {
            Self::Coefficients(_) => true,
            Self::Expression(law) => law.is_open(x, v),
        }
    }

    /// Deceleration (m/s²) at every depth in `x` and every velocity in `v`, not negative.
    fn deceleration(&self, x: Ball, v: Ball) -> Ball {
        match self {
            Self::Coefficients(law) => law.deceleration(x, v),
            Self::Expression(law) => law.deceleration(x, v),
        }
    }

    /// Upper bound of w, with which the error N is measured through the stage (1/s).
    fn rate(&self) -> f64 {
        match self {
            Self::Coefficients(law) => law.rate,
            Self::Expression(_) => 0.0,
        }
    }
}

/// The coefficients of a stage over the mass.
struct Coefficients {
    per_mass: Stage<Ball>,
    /// Whether the force falls with depth.
    falls: bool,
    /// Upper bound of w, `w² = |s|/M` (1/s).
    rate: f64,
    /// Lower bound of w (1/s).
    least_rate: f64,
}

impl Coefficients {
    fn new(stage: &Stage<Ball>, mass: Ball) -> Option<Self> {
        let per_mass = stage.per_mass(mass);
        let Stage { stiffness, viscosity, drag, .. } = per_mass;
        let falls = stiffness.value() < 0.0;
        let is_proved = if falls {
            stiffness.upper() <= 0.0 && viscosity.is_zero() && drag.is_zero()
        } else {
            stiffness.lower() >= 0.0 && viscosity.lower() >= 0.0 && drag.lower() >= 0.0
        };
        let rate = if stiffness.is_zero() { 0.0 } else { stiffness.magnitude().sqrt() * UP };
        let least_rate = if falls { -stiffness } else { stiffness }.lower().max(0.0).sqrt() / UP;
        let is_finite = per_mass.static_force.radius.is_finite() && rate.is_finite() && drag.radius.is_finite();
        (is_proved && is_finite && viscosity.radius.is_finite()).then_some(Self { per_mass, falls, rate, least_rate })
    }

    /// Deceleration (m/s²) at every depth in `x` and every velocity in `v`, not negative.
    fn deceleration(&self, x: Ball, v: Ball) -> Ball {
        let Stage { static_force, stiffness, viscosity, drag, .. } = self.per_mass;
        let mut sum = static_force;
        if !stiffness.is_zero() {
            sum += stiffness * x;
        }
        if !(viscosity.is_zero() && drag.is_zero()) {
            sum += (viscosity + drag * v) * v;
        }
        sum
    }
}

/// The polynomials of one step, in units of time and velocity that are powers of two, from `x = 0`.
struct Series {
    /// Unit of time (s) and of velocity (m/s).
    time: f64,
    velocity: f64,
    /// The first coefficients of v, and of x.
    fine: [DoubleWord; FINE],
    fine_depth: [DoubleWord; FINE + 1],
    /// All of them, rounded.
    coarse: [f64; ORDER + 1],
    coarse_depth: [f64; ORDER + 2],
    defect: Defect,
}

/// What bounds the defect of the polynomials.
enum Defect {
    /// The coefficients p, s, r, q of the law in units of the series.
    Coefficients([Ball; 4]),
    /// What the polynomials miss, order by order.
    Misses(Box<Misses>),
}

impl Series {
    /// The series from depth `x` and velocity `v`, both exact; `None` where an expression has none.
    fn new(law: &Law<'_>, x: DoubleWord, v: DoubleWord, limit: f64) -> Option<Self> {
        match law {
            Law::Coefficients(law) => Some(Self::of_coefficients(law, x, v, limit)),
            Law::Expression(law) => law.series(x, v, limit),
        }
    }

    /// Polynomials without coefficients yet.
    fn empty(time: f64, velocity: f64, defect: Defect) -> Self {
        Self {
            time,
            velocity,
            fine: [DoubleWord::default(); FINE],
            fine_depth: [DoubleWord::default(); FINE + 1],
            coarse: [0.0; ORDER + 1],
            coarse_depth: [0.0; ORDER + 2],
            defect,
        }
    }

    fn of_coefficients(law: &Coefficients, x: DoubleWord, v: DoubleWord, limit: f64) -> Self {
        let Stage { static_force, stiffness, viscosity, drag, .. } = law.per_mass;
        let mut at_start = static_force;
        if !stiffness.is_zero() {
            at_start += stiffness * Ball::around(x, 0.0);
        }
        let speed = v.hi;
        let mut rate = (at_start.magnitude() / speed).max(law.rate);
        rate = rate.max(viscosity.magnitude() + 2.0 * drag.magnitude() * speed);
        if rate == 0.0 {
            rate = speed / (limit - x.hi).max(1e-100);
        }
        let (time, velocity) = (power_of_two_below(1.0 / rate), power_of_two_below(speed));
        let per_velocity = time / velocity;
        let law = [
            at_start.scaled(per_velocity),
            stiffness.scaled(time * time),
            viscosity.scaled(time),
            drag.scaled(time * velocity),
        ];
        let mut series = Self::empty(time, velocity, Defect::Coefficients(law));
        series.fill(&law, v.scaled(1.0 / velocity));
        series
    }

    /// `v[k+1] = -([k = 0] p + s x[k] + r v[k] + q sum of v[i] v[k-i])/(k+1)`, `x[k+1] = v[k]/(k+1)`.
    fn fill(&mut self, law: &[Ball; 4], start: DoubleWord) {
        let [p, s, r, q] = law.map(|number| number.mid);
        let has = law.map(|number| !number.is_zero());
        let fine = &mut self.fine;
        let depth = &mut self.fine_depth;
        fine[0] = start;
        for k in 0..FINE {
            depth[k + 1] = fine[k].over((k + 1) as f64);
            if k + 1 == FINE {
                break;
            }
            let mut sum = if k == 0 { p } else { DoubleWord::default() };
            if has[1] && k > 0 {
                sum = sum.plus(s.times(depth[k]));
            }
            if has[2] {
                sum = sum.plus(r.times(fine[k]));
            }
            if has[3] {
                let mut square = DoubleWord::default();
                for i in 0..k.div_ceil(2) {
                    square = square.plus(fine[i].times(fine[k - i]));
                }
                square = square.scaled(2.0);
                if k % 2 == 0 {
                    square = square.plus(fine[k / 2].times(fine[k / 2]));
                }
                sum = sum.plus(q.times(square));
            }
            fine[k + 1] = -sum.over((k + 1) as f64);
        }
        let (v, x) = (&mut self.coarse, &mut self.coarse_depth);
        for k in 0..FINE {
            v[k] = fine[k].hi;
            x[k] = depth[k].hi;
        }
        x[FINE] = depth[FINE].hi;
        let [s, r, q] = [s.hi, r.hi, q.hi];
        for k in FINE - 1..ORDER {
            let mut sum = s * x[k] + r * v[k];
            if has[3] {
                let mut square = 0.0;
                for i in 0..k.div_ceil(2) {
                    square += v[i] * v[k - i];
                }
                square *= 2.0;
                if k % 2 == 0 {
                    square += v[k / 2] * v[k / 2];
                }
                sum += q * square;
            }
            v[k + 1] = -sum / (k + 1) as f64;
            if k + 1 > FINE {
                x[k + 1] = v[k] * reciprocal::<f64>(k + 1);
            }
        }
        x[ORDER + 1] = v[ORDER] * reciprocal::<f64>(ORDER + 1);
    }

    /// Length of a step that truncates about [`TRUNCATION`] of the velocity.
    fn span(&self, law: &Law<'_>) -> f64 {
        let goal = TRUNCATION * self.coarse[0];
        let by = |k: usize| (goal / self.coarse[k].abs()).powf(reciprocal::<f64>(k));
        let span = by(ORDER).min(by(ORDER - 1));
        match law {
            Law::Coefficients(law) if law.rate > 0.0 => {
                let phase = law.rate * self.time;
                span.min(SPAN_MAX.min(if law.falls { 0.99 * GROWTH_MAX } else { PHASE_MAX } / phase))
            }
            Law::Coefficients(_) => span.min(SPAN_MAX),
            Law::Expression(_) => (law::SHARE * span).min(SPAN_MAX),
        }
    }

    /// Approximate v, its slope, and x at `time`.
    fn near(&self, time: f64) -> [f64; 3] {
        let (mut v, mut slope, mut x) = (0.0, 0.0, self.coarse_depth[ORDER + 1]);
        for k in (0..=ORDER).rev() {
            slope = slope * time + v;
            v = v * time + self.coarse[k];
            x = x * time + self.coarse_depth[k];
        }
        [v, slope, x]
    }

    /// What bounds the coefficients up to `time`: `|v[k]| time^k` and `|x[k]| time^k`, with all powers and roundings.
    fn sizes(&self, time: f64) -> Sizes {
        let (mut v, mut x) = ([0.0; ORDER + 1], [0.0; ORDER + 2]);
        let mut power = 1.0;
        for k in 0..=ORDER {
            v[k] = self.coarse[k].abs() * power * UP;
            x[k] = self.coarse_depth[k].abs() * power * UP;
            power *= time;
        }
        x[ORDER + 1] = self.coarse_depth[ORDER + 1].abs() * power * UP;
        let mut behind = [0.0; ORDER + 2];
        for k in (0..=ORDER).rev() {
            behind[k] = behind[k + 1] + v[k];
        }
        Sizes { v, x, behind }
    }

    /// v and x at `time`, and bounds of what evaluating them rounds.
    fn at(&self, time: f64, sizes: &Sizes) -> ([DoubleWord; 2], [f64; 2]) {
        let (mut tail, mut depth_tail) = (0.0, self.coarse_depth[ORDER + 1]);
        for k in (FINE..=ORDER).rev() {
            tail = tail * time + self.coarse[k];
            if k > FINE {
                depth_tail = depth_tail * time + self.coarse_depth[k];
            }
        }
        let h = DoubleWord::of(time);
        let (mut v, mut x) = (DoubleWord::of(tail), DoubleWord::of(depth_tail));
        x = x.times(h).plus(self.fine_depth[FINE]);
        for k in (0..FINE).rev() {
            v = v.times(h).plus(self.fine[k]);
            x = x.times(h).plus(self.fine_depth[k]);
        }
        let (speed, depth): (f64, f64) = (sizes.behind[0], sizes.x.iter().sum());
        let rounding =
            |tail: f64, whole: f64| (2 * ORDER) as f64 * ROUNDOFF * tail + (2 * FINE + 8) as f64 * UNIT * whole;
        let depth_behind: f64 = sizes.x[FINE + 1..].iter().sum();
        let errors = [rounding(sizes.behind[FINE], speed), rounding(depth_behind, depth)];
        ([v, x], errors.map(|error| error * UP + TINY))
    }

    /// Whether v stays above `error` from 0 to `time`.
    ///
    /// Between two places of a panel v is above the lesser of both by no less than `-(b - a)²/8 max|v''|`. Where the slope is
    /// negative throughout a panel, v is above its end.
    fn stays_above(&self, error: f64, time: f64, sizes: &Sizes) -> bool {
        let (mut second, mut third) = (0.0, 0.0);
        for k in 2..=ORDER {
            let k_f = k as f64;
            let size = sizes.v[k] * k_f * (k_f - 1.0);
            second += size;
            third += size * (k_f - 2.0);
        }
        let (second, third) = (second / (time * time) * UP, third / (time * time * time) * UP);
        let slope_size: f64 = (1..=ORDER).map(|k| k as f64 * sizes.v[k]).sum::<f64>() / time;
        let rounding = (4 * ORDER) as f64 * ROUNDOFF;
        let (value_error, slope_error) = (rounding * sizes.behind[0] * UP, rounding * slope_size * UP);
        // The last place is that of an event, where v is known better than its approximation says.
        let end = {
            let ([v, _], [rounding, _]) = self.at(time, sizes);
            Ball::around(v, rounding).lower()
        };
        if !(end > error) {
            return false;
        }
        // Depth first from the start: at most one panel waits at each level.
        let mut waiting = SmallVec::<[(f64, f64); 64]>::new();
        let mut count = 0;
        waiting.push((0.0, time));
        while let Some((a, b)) = waiting.pop() {
            count += 1;
            let ([at_a, slope_a, _], [at_b, slope_b, _]) = (self.near(a), self.near(b));
            let (at_a, at_b) = (at_a - value_error, if b == time { end } else { at_b - value_error });
            let width = b - a;
            let sag = width * width * 0.125 * UP;
            let is_above = at_a.min(at_b) - sag * second > error * UP;
            let falls = at_b > error * UP && slope_a.max(slope_b) + slope_error + sag * third < 0.0;
            if is_above || falls {
                continue;
            }
            let middle = 0.5 * (a + b);
            if count > PANELS_MAX || middle <= a || middle >= b {
                return false;
            }
            waiting.push((middle, b));
            waiting.push((a, middle));
        }
        true
    }

    /// A time nearer to the passage of `far`, from one that is near it: by Newton's method in double words. Where the speed is
    /// all but lost, the numbers of [`Series::near`] leave half of the digits of the time open.
    fn passage(&self, mut time: f64, far: DoubleWord) -> f64 {
        for _ in 0..20 {
            let ([v, x], _) = self.at(time, &self.sizes(time));
            let step = x.plus(-far).hi / v.hi;
            let next = time - step;
            if !(v.hi > 0.0 && next > 0.0) || next == time {
                break;
            }
            time = next;
            if step.abs() <= ROUNDOFF * time {
                break;
            }
        }
        time
    }

    /// A place in 0 to `end` near which `f` changes its sign from positive, by regula falsi and bisection.
    fn root(&self, end: f64, f: impl Fn([f64; 3]) -> (f64, f64)) -> f64 {
        let (mut low, mut high) = (0.0, end);
        let mut t = end;
        for _ in 0..100 {
            let (value, slope) = f(self.near(t));
            if value > 0.0 {
                low = t;
            } else {
                high = t;
            }
            let newton = t - value / slope;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - t).abs() <= 2.0 * ROUNDOFF * t || next <= low || next >= high {
                return next;
            }
            t = next;
        }
        t
    }
}

/// Bounds of the coefficients of a step at its end.
struct Sizes {
    v: [f64; ORDER + 1],
    x: [f64; ORDER + 2],
    /// Sums of `v[k]` from k on.
    behind: [f64; ORDER + 2],
}

impl Sizes {
    /// Bounds of the integrals of |dv| and |dx| from 0 to `time`, with the coefficients p, s, r, q in units of the step.
    fn defects(&self, law: &[Ball; 4], time: f64) -> [f64; 2] {
        let Self { v, x, behind } = self;
        let [p, s, r, q] = law.map(Ball::magnitude);
        let speed = behind[0];
        let depth: f64 = x.iter().sum();
        let order = FINE - 1;
        let depth_behind: f64 = x[order..].iter().sum();
        // Products of two coefficients of v whose orders sum up to `order` or more.
        let products = |order: usize| -> f64 { (0..=ORDER).map(|i| v[i] * behind[order.saturating_sub(i)]).sum() };
        let has_drag = !law[3].is_zero();
        let of_order = |order: usize| if has_drag { q * products(order) } else { 0.0 };
        let of_one = r * behind[ORDER] + s * (x[ORDER] + x[ORDER + 1]);
        let truncation = (of_one + of_order(ORDER)) * reciprocal::<f64>(ORDER + 1);
        let fine = (FINE + 12) as f64 * UNIT * (p + s * depth + r * speed + q * speed * speed);
        let coarse = s * depth_behind + r * behind[order] + of_order(order);
        let coarse = (ORDER + 16) as f64 * ROUNDOFF * coarse * reciprocal::<f64>(FINE);
        let [of_p, of_s, of_r, of_q] = law.map(|number| number.radius);
        let uncertain = of_p + of_s * depth + of_r * speed + of_q * speed * speed;
        let force = time * (truncation + fine + coarse + uncertain);
        let path = time * (4.0 * UNIT * speed + 4.0 * ROUNDOFF * behind[FINE]);
        [force * UP + TINY, path * UP + TINY]
    }
}

/// A state in a step: exact numbers, and how far off they may be.
#[derive(Clone, Copy, Debug)]
struct Centre {
    time: Ball,
    x: DoubleWord,
    v: DoubleWord,
    error: Error,
}

/// What a step leads to.
enum Step {
    /// On to the next.
    Whole(Centre),
    /// To the end of the stage.
    Limit(State<Ball>),
    /// To rest before it.
    Rest(State<Ball>),
    /// To a condition that ends the stage before it.
    Condition(State<Ball>),
    /// To limit or rest.
    Either(State<Ball>),
    /// No proof was found.
    Unproved,
}

impl Centre {
    fn new(state: State<Ball>, law: &Law<'_>) -> Self {
        let State { time, depth, velocity } = state;
        let norm = (velocity.radius + law.rate() * depth.radius) * UP;
        let error = Error { norm, velocity: velocity.radius, depth: depth.radius };
        Self { time, x: depth.mid, v: velocity.mid, error }
    }

    fn depth(&self) -> Ball {
        Ball::around(self.x, self.error.depth)
    }

    fn velocity(&self) -> Ball {
        Ball::around(self.v, self.error.velocity)
    }

    fn state(&self) -> State<Ball> {
        State { time: self.time, depth: self.depth(), velocity: self.velocity() }
    }

    /// The state `time` units of `series` later, provided that v stays positive until then; `None` where that is not proved.
    fn after(&self, law: &Law<'_>, series: &Series, time: f64) -> Option<Self> {
        if time <= 0.0 {
            return Some(*self);
        }
        let sizes = series.sizes(time);
        let (error, greatest) = match law {
            Law::Coefficients(law) => self.error_after(law, series, time, &sizes)?,
            Law::Expression(law) => law.error_after(self, series, time)?,
        };
        if !series.stays_above(greatest / series.velocity * UP, time, &sizes) {
            return None;
        }
        let ([v, x], [of_v, of_x]) = series.at(time, &sizes);
        let length = series.velocity * series.time;
        let reached = Ball::around(self.x, 0.0) + Ball::around(x.scaled(length), length * of_x * UP);
        let error = Error {
            norm: (error.norm + series.velocity * of_v + law.rate() * reached.radius) * UP,
            velocity: (error.velocity + series.velocity * of_v) * UP,
            depth: (error.depth + reached.radius) * UP,
        };
        let time = self.time + Ball::from_f64(time * series.time);
        Some(Self { time, x: reached.mid, v: v.scaled(series.velocity), error })
    }

    /// The error of the polynomials at `time`, and the greatest of V until then.
    fn error_after(&self, law: &Coefficients, series: &Series, time: f64, sizes: &Sizes) -> Option<(Error, f64)> {
        let Defect::Coefficients(numbers) = &series.defect else { return None };
        let [force, path] = sizes.defects(numbers, time);
        let phase = law.rate * series.time;
        let added = series.velocity * (force + phase * path) * UP;
        let growth = if law.falls {
            let y = phase * time * UP;
            if y > GROWTH_MAX {
                return None;
            }
            1.0 + y + y * y
        } else {
            1.0
        };
        let norm = (self.error.norm + added) * growth * UP;
        let length = series.velocity * series.time;
        let duration = series.time * time;
        let depth = self.error.depth + length * path + duration * norm;
        let depth = if law.least_rate > 0.0 { depth.min(norm / law.least_rate * UP) } else { depth } * UP;
        // The same of ev alone: viscosity lets it die out.
        let added = (series.velocity * force + law.rate * law.rate * depth * duration) * UP;
        let damping = law.per_mass.viscosity.lower().max(0.0) * duration / UP;
        let rest = UP / (1.0 + damping + 0.5 * damping * damping);
        let velocity = norm.min(self.error.velocity * rest + added) * UP;
        let greatest = norm.min(self.error.velocity + added) * UP;
        Some((Error { norm, velocity, depth }, greatest))
    }

    /// From here to rest, over a box so small that the force hardly changes: `T = v/a`, `X = v²/(2 a)` with a mean `a`.
    fn until_rest(&self, law: &Law<'_>) -> Option<State<Ball>> {
        let velocity = self.velocity();
        if velocity.lower() > 0.0 { self.slowed(law, velocity) } else { None }
    }

    /// The same from any of the `velocities`, none negative, at this time and depth.
    fn slowed(&self, law: &Law<'_>, velocities: Ball) -> Option<State<Ball>> {
        let (depth, fastest) = (self.depth(), velocities.upper());
        let speeds = Ball::between(0.0, fastest);
        let weakest = law.deceleration(depth, speeds).lower();
        if !(weakest > 0.0) {
            return None;
        }
        let reach = fastest * fastest / weakest * UP;
        let box_of = Ball::between(depth.lower(), (depth + Ball::from_f64(reach)).upper());
        let deceleration = law.deceleration(box_of, speeds);
        let distance = (velocities * velocities / deceleration).scaled(0.5);
        let is_inside = deceleration.lower() > 0.0 && distance.upper() <= reach && law.is_open(box_of, speeds);
        let time = self.time + velocities / deceleration;
        is_inside.then(|| State { time, depth: depth + distance, velocity: Ball::zero() })
    }

    /// From here to `limit`, over a box as small: `T = d/v` with a mean v.
    fn until_limit(&self, law: &Law<'_>, limit: Ball) -> Option<State<Ball>> {
        let (depth, velocity) = (self.depth(), self.velocity());
        let distance = limit - depth;
        let (slowest, fastest) = (velocity.lower(), velocity.upper());
        if !(distance.lower() >= 0.0 && slowest > 0.0) {
            return None;
        }
        let box_of = depth.hull(limit);
        let mut speeds = Ball::between(0.5 * slowest, 2.0 * fastest);
        let longest = distance.upper() / (0.5 * slowest) * UP;
        for _ in 0..2 {
            let change = law.deceleration(box_of, speeds).magnitude() * longest * UP;
            if !(change < 0.5 * slowest) {
                return None;
            }
            speeds = velocity.widened(change);
        }
        if !law.is_open(box_of, speeds) {
            return None;
        }
        let time = distance / speeds;
        let velocity = velocity - law.deceleration(box_of, speeds) * time;
        Some(State { time: self.time + time, depth: limit, velocity })
    }
}

impl Steps {
    /// One step from `centre` towards `limit`.
    fn step(law: &Law<'_>, centre: &Centre, limit: Ball, series: &Series) -> Step {
        let length = series.velocity * series.time;
        let is_endless = limit.value() == f64::INFINITY;
        let far = if is_endless { f64::INFINITY } else { (limit - Ball::around(centre.x, 0.0)).value() / length };
        let mut span = series.span(law);
        let mut retries = RETRIES_MAX;
        if let Law::Expression(law) = law {
            span = law.until_kink(centre, series, span);
            // Near a kink the box of a step shows its side in a short step only.
            retries = 32;
        }
        for _ in 0..retries {
            if matches!(law, Law::Expression(_)) && span < law::SPAN_MIN {
                break;
            }
            if let Some(state) = Self::condition(law, centre, limit, series, span) {
                return Step::Condition(state);
            }
            let [v, _, x] = series.near(span);
            if v > 0.0 && x < far {
                match centre.after(law, series, span) {
                    Some(next) if is_before(next.depth(), limit) => return Step::Whole(next),
                    _ => {}
                }
            } else {
                let found = Self::event(law, centre, limit, series, span, far);
                if !matches!(found, Step::Unproved) {
                    return found;
                }
            }
            span *= 0.5;
        }
        Step::Unproved
    }

    /// The state in which the condition of the stage is met within `span`, proved to be the first event.
    fn condition(law: &Law<'_>, centre: &Centre, limit: Ball, series: &Series, span: f64) -> Option<State<Ball>> {
        let Law::Expression(own) = law else { return None };
        let ending = own.ending.as_ref()?;
        let near = ending.root(centre, series, span)?;
        let mut gap = 16.0 * ROUNDOFF * near + 8.0 * centre.error.velocity / series.velocity;
        gap += ending.uncertainty(centre, series, near);
        for _ in 0..RETRIES_MAX {
            let before = centre.after(law, series, (near - gap).max(0.0));
            if let Some(state) = before.and_then(|before| ending.met(own, &before, limit)) {
                return Some(state);
            }
            if gap > near {
                break;
            }
            gap *= 16.0;
        }
        None
    }

    /// The event within `span`, proved to be the first.
    fn event(law: &Law<'_>, centre: &Centre, limit: Ball, series: &Series, span: f64, far: f64) -> Step {
        let length = series.velocity * series.time;
        let rest = if series.near(span)[0] > 0.0 { None } else { Some(series.root(span, |[v, slope, _]| (v, slope))) };
        let until = rest.unwrap_or(span);
        let passes = far < f64::INFINITY && series.near(until)[2] > far;
        let place = |from: f64| {
            // Just before the event, by what the numbers round and by the error.
            let [v, slope, _] = series.near(from);
            let error = if passes {
                (centre.error.depth + limit.radius) / length / v.abs()
            } else {
                centre.error.velocity / series.velocity / slope.abs()
            };
            (16.0 * ROUNDOFF * from + 8.0 * error, from)
        };
        let at_limit = |gap: f64, from: f64| {
            let before = centre.after(law, series, (from - gap).max(0.0))?;
            before.until_limit(law, limit)
        };
        let at_rest = |gap: f64, from: f64| {
            let before = centre.after(law, series, (from - gap).max(0.0))?;
            Some((before, before.until_rest(law)?))
        };
        if passes {
            let mut near = series.root(until, |[v, _, x]| (far - x, -v));
            if series.near(near)[0] < SLOW {
                let missing = (limit - Ball::around(centre.x, 0.0)).mid.scaled(1.0 / length);
                near = series.passage(near, missing);
            }
            let (mut gap, from) = place(near);
            for _ in 0..RETRIES_MAX {
                if let Some(state) = at_limit(gap, from).filter(|state| state.velocity.lower() > 0.0) {
                    return Step::Limit(state);
                }
                gap *= 16.0;
            }
        }
        let Some(rest) = rest else { return Step::Unproved };
        let (mut gap, from) = place(rest);
        for _ in 0..RETRIES_MAX {
            if let Some((before, state)) = at_rest(gap, from) {
                if is_before(state.depth, limit) {
                    return Step::Rest(state);
                }
                if state.depth.lower() <= limit.upper() && before.depth().upper() <= limit.lower() {
                    // Rest or the limit, whichever comes first, comes before either ends.
                    let depth = before.depth().hull(limit);
                    let velocity = Ball::around(DoubleWord::default(), before.velocity().upper());
                    return Step::Either(State { time: before.time.hull(state.time), depth, velocity });
                }
            }
            gap *= 16.0;
        }
        Step::Unproved
    }

    /// A step through an expression: that of its series, unless rest is near or the series proves nothing.
    fn step_of_expression(
        law: &Law<'_>,
        own: &Expression<'_>,
        centre: &Centre,
        limit: Ball,
        (step, series): (Step, Option<&Series>),
    ) -> Step {
        match step {
            Step::Whole(next) => own.rest(law, centre, limit).map_or(Step::Whole(next), Step::Rest),
            Step::Unproved => {
                if let Some(state) = own.rest(law, centre, limit) {
                    return Step::Rest(state);
                }
                own.across(centre, limit, series.map_or(1.0, |series| series.time))
            }
            event => event,
        }
    }

    /// Everything that may follow from `state` on where nothing is proved: at the end of the flight, until the exit.
    fn anything(course: &Course<'_, Ball>, state: State<Ball>) -> State<Ball> {
        let resists = |stage: &Stage<Ball>| stage.static_force.lower() >= 0.0 && stage.stiffness.lower() >= 0.0;
        let resist = course.problem.stages[course.stage..].iter().all(resists);
        let fastest = if resist { state.velocity.upper() } else { f64::INFINITY };
        State {
            time: Ball::around(DoubleWord::of(state.time.lower()), f64::INFINITY),
            depth: Ball::between(state.depth.lower(), course.problem.exit_depth.upper()),
            velocity: Ball::around(DoubleWord::default(), fastest),
        }
    }

    /// The end of a flight that comes to rest next to the end of a stage, on either side of it, if the next stage resists.
    /// A mass that joins there makes neither distance nor time longer: momentum is kept, and energy falls.
    fn on_either_side(course: &Course<'_, Ball>, before: State<Ball>, limit: Ball) -> Option<State<Ball>> {
        let stages = &course.problem.stages;
        let next = (course.stage + 1..stages.len()).find(|index| stages[*index].end != limit)?;
        let at = State { depth: limit, ..before };
        let law = Law::new(&stages[next], course.problem.laws.of(next), course.mass, at)?;
        let beyond = Centre::new(at, &law);
        let speeds = Ball::between(0.0, before.velocity.magnitude());
        let furthest = beyond.slowed(&law, speeds)?;
        is_before(furthest.depth, course.problem.limit_of(next)).then(|| State {
            time: before.time.hull(furthest.time),
            depth: before.depth.hull(furthest.depth),
            velocity: Ball::zero(),
        })
    }

    /// Whether `depth` lies on one side of the exit and of the end of each stage from the present one on.
    fn is_apart(course: &Course<'_, Ball>, depth: Ball) -> bool {
        let ends = course.problem.stages[course.stage..].iter().map(|stage| stage.end);
        ends.chain([course.problem.exit_depth]).all(|end| is_before(depth, end) || depth.lower() >= end.upper())
    }

    /// No proof: the end that is open.
    fn give_up(&mut self, course: &mut Course<'_, Ball>, state: State<Ball>) -> StageEnd<Ball> {
        self.open = Some(state);
        course.notes.push(UNPROVED.to_owned());
        // The loop ends at rest.
        StageEnd::Rest(State { velocity: Ball::zero(), ..state })
    }

    /// Whether speed remains at `limit` through a stage that only slows, `v' = -(r + q v) v`: by its closed form.
    fn arrives(law: &Law<'_>, centre: &Centre, limit: Ball) -> Option<bool> {
        let Law::Coefficients(law) = law else { return Some(true) };
        let Stage { static_force, stiffness, viscosity, drag, .. } = law.per_mass;
        if !(static_force.is_zero() && stiffness.is_zero()) || viscosity.is_zero() {
            return Some(true);
        }
        let distance = limit - centre.depth();
        let left = if drag.is_zero() {
            centre.velocity() - viscosity * distance
        } else {
            let terminal = viscosity / drag;
            (terminal + centre.velocity()) * crate::physics::elementary::Elementary::exp(-(drag * distance)) - terminal
        };
        if left.lower() > 0.0 {
            Some(true)
        } else if left.upper() < 0.0 {
            Some(false)
        } else {
            None
        }
    }

    /// Whether an overdamped driven stage has trapped the projectile before its equilibrium, as in
    /// [`Course::refuse_creep`], proved.
    fn creeps(law: &Law<'_>, centre: &Centre, limit: Ball) -> bool {
        let Law::Coefficients(law) = law else { return false };
        let Stage { static_force, stiffness, viscosity, .. } = law.per_mass;
        if law.falls || !(static_force.upper() < 0.0 && stiffness.lower() > 0.0 && viscosity.lower() > 0.0) {
            return false;
        }
        let half = viscosity.scaled(0.5);
        let root = half * half - stiffness;
        let equilibrium = -static_force / stiffness;
        let missing = equilibrium - centre.depth();
        root.lower() >= 0.0
            && (limit.value() == f64::INFINITY || limit.lower() >= equilibrium.upper())
            && missing.lower() > 0.0
            && centre.velocity().upper() <= ((half + root.sqrt()) * missing).lower()
    }
}

impl StageSolver<Ball> for Steps {
    fn solve_stage(&mut self, course: &mut Course<'_, Ball>) -> Solved<StageEnd<Ball>> {
        let stage = &course.problem.stages[course.stage];
        let forces = [stage.static_force, stage.stiffness, stage.viscosity, stage.drag];
        let is_own = course.problem.laws.of(course.stage).is_some();
        if !is_own && !forces.iter().all(|force| is_in_range(*force) && is_in_range(*force / course.mass)) {
            return Err(out_of_range());
        }
        let is_open = |number: Ball| number.lower() < 0.0 && number.upper() > 0.0;
        if !is_own
            && course.problem.limit_of(course.stage).value() == f64::INFINITY
            && (is_open(stage.static_force) || is_open(stage.stiffness))
        {
            // Whether anything stops it is not known.
            let state = Self::anything(course, course.state);
            return Ok(self.give_up(course, state));
        }
        let limit = course.limit()?;
        let impact = course.problem.impact_speed.value();
        let table = course.problem.laws.of(course.stage).and_then(OwnLaw::table);
        let is_known = table.is_none_or(|table| is_on_piece(table, course.state.velocity));
        let law = is_known.then(|| Law::new(stage, course.law(), course.mass, course.state)).flatten();
        let Some(law) = law else {
            let state = Self::anything(course, course.state);
            return Ok(self.give_up(course, state));
        };
        let mut centre = Centre::new(course.state, &law);
        match Self::arrives(&law, &centre, limit) {
            Some(true) => {}
            Some(false) => {
                let why = "viscosity slows it towards a place before the far side, which it never reaches";
                return Err(IntegrationError::NeverEnds { why, last: course.state.values() });
            }
            None => {
                let state = Self::anything(course, course.state);
                return Ok(self.give_up(course, state));
            }
        }
        let steps_max = course.cost.steps + if is_own { OWN_STEPS_MAX } else { STEPS_MAX };
        let slowest = if is_own { STILL * impact } else { 0.0 };
        while course.cost.steps < steps_max.min(STEPS_MAX) && centre.v.hi >= slowest {
            if Self::creeps(&law, &centre, limit) {
                let why = "viscosity lets it only creep towards the depth where the spring balances the drive";
                return Err(IntegrationError::NeverEnds { why, last: centre.state().values() });
            }
            let work = Cost { steps: 1, rejected_steps: 0, force_evaluations: ORDER as u64 };
            course.cost = course.cost + work;
            let series = Series::new(&law, centre.x, centre.v, limit.value());
            let mut step = series.as_ref().map_or(Step::Unproved, |series| Self::step(&law, &centre, limit, series));
            if let Law::Expression(own) = &law {
                step = Self::step_of_expression(&law, own, &centre, limit, (step, series.as_ref()));
            }
            let end = match &step {
                Step::Whole(next) => next.state(),
                Step::Limit(state) | Step::Rest(state) | Step::Condition(state) | Step::Either(state) => *state,
                Step::Unproved => break,
            };
            let start = centre;
            course.sample_until(end, |time| {
                let Some(series) = &series else { return start.state() };
                let [v, _, x] = series.near((time - start.time.value()) / series.time);
                let depth = start.x.hi + x * series.velocity * series.time;
                State { time, depth, velocity: v * series.velocity }.cast::<Ball>()
            });
            course.error_bound = 2.0 * end.velocity.magnitude() * end.velocity.radius / impact / impact * UP;
            match step {
                Step::Whole(next) => {
                    centre = next;
                    course.sample(end);
                }
                Step::Limit(state) => return Ok(StageEnd::Limit(state)),
                Step::Rest(state) => return Ok(StageEnd::Rest(state)),
                // What comes next is known where it lies on one side of every boundary.
                Step::Condition(state) if Self::is_apart(course, state.depth) => return Ok(StageEnd::Condition(state)),
                Step::Either(state) => {
                    let is_last = limit == course.problem.exit_depth;
                    let beside = || Self::on_either_side(course, state, limit);
                    let state = if is_last { Some(state) } else { beside() };
                    let state = state.unwrap_or_else(|| Self::anything(course, centre.state()));
                    return Ok(self.give_up(course, state));
                }
                Step::Condition(_) | Step::Unproved => break,
            }
        }
        let state = Self::anything(course, centre.state());
        Ok(self.give_up(course, state))
    }

    /// Where it is open, so is the flight: the stage is entered and given up ([`Law::new`]), or the flight ends with a mass that may
    /// have joined.
    fn meets(&mut self, condition: &Condition<Ball>, at: State<Ball>) -> bool {
        let is_met = ending::is_met(condition, at);
        if is_met.is_none() && self.open.is_none() {
            self.open = Some(State { velocity: Ball::between(0.0, at.velocity.magnitude()), ..at });
        }
        is_met == Some(true)
    }

    fn margin(&mut self, course: &mut Course<'_, Ball>) -> Solved<Bounded> {
        let margin = course.margin();
        let energy = course.problem.mass * course.problem.impact_speed * course.problem.impact_speed;
        let stage = course.stage.min(course.problem.stages.len() - 1);
        let of_depth = || {
            let force = course.problem.force(stage, course.state.depth, Ball::zero());
            (force * course.state.depth / energy).magnitude()
        };
        // The margin is a number, and that of a stop is continued from the depth as rounded.
        let rounding = if course.is_through { 4.0 * margin.value } else { of_depth() };
        let bound = margin.bound + f64::EPSILON * 2.0 * rounding;
        if let Some(State { velocity, .. }) = &self.open {
            // Between a stop there and all of the speed that may be left.
            let left = (*velocity / course.problem.impact_speed).magnitude();
            return Ok(Bounded { bound: bound + margin.value.abs() + left * left, ..margin });
        }
        let is_of_law = course.problem.laws.of(stage).is_some();
        if is_of_law && !course.is_through {
            return Ok(margin);
        }
        let margin = Bounded { bound, ..margin };
        if margin.is_decided() || course.is_through {
            return Ok(margin);
        }
        // Proved, and lost in the rounding of the margin: what the rest of the stage takes at least.
        let (problem, stage) = (course.problem, course.stage);
        let work = problem.stages[stage].static_work(course.state.depth, problem.limit_of(stage));
        let lacking = (work / energy).scaled(-2.0);
        Ok(Bounded { value: lacking.value(), bound: lacking.radius * UP })
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests;
