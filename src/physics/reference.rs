//! What is the answer to 50 digits? The reference that every 64-bit number of the project is measured against.
//!
//! The same equation of motion as everywhere, `M dV/dt = -(p + s x + r V + q V²)`, solved with big floats
//! (`dashu-float`) and **independently of [`super::closed_form`]**: from the plain definitions, which lose digits, and
//! enough digits to lose. Each answer is computed at two precisions (256 and 384 bits, then half as much again each time)
//! until they agree to 52 decimal digits; the inputs are the `f64` given, taken as exact.
//!
//! ```text
//! p, q   W = (V0² + p/q) e^{-y} - p/q,  y = 2 q (x - x0)/M        t = (M/sqrt(p q)) [atan(V sqrt(q/p))] from V to V0
//! p, s   W = V0² - (2 p xi + s (x² - x0²))/M                      t = [atan2(w u, V)]/w,  u = x + p/s,  w² = s/M
//!        s < 0:                                                  t = [-ln(V - w u)]/w,  w² = -s/M
//! p, r   V = (V0 + p/r) e^{-r t/M} - p/r                          x(t) its integral, inverted by root finding
//! p, s, r  u = A e^{-l1 t} + B e^{-l2 t}, or damped sine           the same
//! p, s, q  W = W_p(x) + (V0² - W_p(x0)) e^{-y},  W_p = s M/(2 q²) - (p + s x)/q;   t = ∫ dx/V by quadrature
//! ```
//!
//! From a [`Scene`] it starts at the scene's own numbers (mass, diameter, strength ...), so that rounding in resolving
//! a scene counts as error too; from a [`Problem`] at its coefficients. Critical velocities come from W at the stage
//! ends being affine in V0², not from the formulas of docs/theory.md, section 2. Condition numbers are difference quotients
//! with a relative step of 2^-80, a step that only this precision can afford.

use std::cmp::Ordering;

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use thiserror::Error;

use super::law::Laws;
use super::problem::{Event, EventKind, Outcome, Problem, Stage, Stages, State, Target};
use super::scene::{CraterStiffness, Criterion, Force, Resistance, Scene};

/// A binary float of any precision, rounding half to even.
type Big = FBig<HalfEven, 2>;

/// Bits of the first attempt: 77 decimal digits.
const FIRST_BITS: usize = 256;
/// Attempts before an answer is given up; the last has 6561 bits.
const ATTEMPTS: usize = 8;
/// Two attempts agree when they differ by less than 2^-AGREEMENT_BITS of the value: 52 digits.
const AGREEMENT_BITS: isize = 173;
/// Relative step of the difference quotients is 2^-STEP_BITS: their error is near 2^-80, far below any error bound.
const STEP_BITS: isize = 80;

/// A number known to 50 digits.
#[derive(Clone, Debug, PartialEq)]
pub struct Exact(Big);

impl Exact {
    /// One, the scale of errors of dimensionless numbers.
    pub fn one() -> Self {
        Self(int(1, FIRST_BITS))
    }

    /// The nearest `f64`.
    pub fn to_f64(&self) -> f64 {
        self.0.to_f64().value()
    }

    /// `|value - exact|/|exact|`, rounded only at the end; infinite when the exact value is zero and `value` is not,
    /// or when `value` is not finite.
    pub fn relative_error(&self, value: f64) -> f64 {
        self.error_over(value, self)
    }

    /// `|value - exact|/|scale|`, as [`Exact::relative_error`] with a scale of its own: velocities are judged by V0.
    pub fn error_over(&self, value: f64, scale: &Self) -> f64 {
        if value.is_finite() { quotient(big(value, FIRST_BITS) - &self.0, &scale.0, 0) } else { f64::INFINITY }
    }

    /// Whether it lies between two numbers, either of which may be infinite.
    pub fn lies_between(&self, (low, high): (f64, f64)) -> bool {
        let is_above = low == f64::NEG_INFINITY || (low < f64::INFINITY && big(low, FIRST_BITS) <= self.0);
        let is_below = high == f64::INFINITY || (high > f64::NEG_INFINITY && self.0 <= big(high, FIRST_BITS));
        is_above && is_below
    }

    /// Decimal digits, `digits` significant ones.
    pub fn to_decimal(&self, digits: usize) -> String {
        let decimal = self.0.to_decimal().value();
        decimal.with_precision(digits).value().to_string()
    }
}

/// A place and an instant to 50 digits.
pub type ExactState = State<Exact>;

/// An event and its exact state.
pub type ExactEvent = Event<Exact>;

/// A flight to 50 digits.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactFlight {
    /// How it ended; never `Undecided`.
    pub outcome: Outcome,
    /// Index from 0 of the stage in which it ended.
    pub stage: usize,
    /// State at the end.
    pub end: ExactState,
    /// Events in time order.
    pub events: Vec<ExactEvent>,
    /// Exit margin `W(exit)/V0²` ([`super::exit_energy`]).
    pub exit_margin: Option<Exact>,
    /// Impact speed V0 (m/s), the scale of velocity errors.
    pub impact_speed: Exact,
}

impl ExactFlight {
    /// State at x = k d, if the flight reached it.
    pub fn crater_end(&self) -> Option<&ExactState> {
        self.events.iter().find(|e| e.kind == EventKind::CraterEnd).map(|e| &e.state)
    }

    fn same_course(&self, other: &Self) -> bool {
        self.outcome == other.outcome
            && self.stage == other.stage
            && self.events.iter().map(|e| e.kind).eq(other.events.iter().map(|e| e.kind))
    }

    fn agrees(&self, other: &Self) -> bool {
        let states = |a: &ExactState, b: &ExactState| {
            [(&a.time, &b.time), (&a.depth, &b.depth), (&a.velocity, &b.velocity)]
                .iter()
                .all(|(a, b)| agree(&a.0, &b.0))
        };
        self.same_course(other)
            && states(&self.end, &other.end)
            && self.events.iter().zip(&other.events).all(|(a, b)| states(&a.state, &b.state))
            && match (&self.exit_margin, &other.exit_margin) {
                // A margin that is all cancellation is good to 50 digits of one.
                (Some(Exact(a)), Some(Exact(b))) => agree(a, b) || (magnitude(a - b) << AGREEMENT_BITS) < Big::ONE,
                (None, None) => true,
                _ => false,
            }
    }
}

/// Critical velocity and energy to 50 digits.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactCritical {
    /// Critical velocity `V_c` (m/s).
    pub velocity: Exact,
    /// Critical energy `E_c = M V_c²/2` (J).
    pub energy: Exact,
}

/// Condition numbers: the sum over all inputs p of `|p df/dp|/|f|`, so that inputs off by one ulp each move f by no
/// more than so many ulps. Of depth, time and velocity at the end, and of time and velocity at x = k d (zero where it is
/// not reached); velocities are taken over V0.
pub type Conditions = [f64; 5];

/// Why there is no reference answer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The reference knows no solution of this stage.
    #[error("no reference for stage {stage}: {why}")]
    Unsupported {
        /// Index of the stage from 0.
        stage: usize,
        /// What prevents it.
        why: &'static str,
    },
    /// Nothing stops the projectile and there is no far side.
    #[error("the flight never ends")]
    NeverEnds,
    /// There is no far side to perforate, or a viscous stage before it.
    #[error("there is no critical velocity")]
    NoCritical,
    /// The scene gives layers, or no impact speed where one is needed.
    #[error("the reference does not read this scene: {0}")]
    Scene(&'static str),
    /// Two precisions never agreed: a tie finer than the numbers resolve.
    #[error("{0} bits do not decide the answer")]
    Undecided(usize),
}

/// Where the exact inputs come from.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a> {
    /// A problem's coefficients.
    Problem(&'a Problem),
    /// A scene's numbers, at this impact speed (m/s).
    Scene(&'a Scene, f64),
}

/// The flight of `source` to 50 digits.
///
/// # Errors
/// [`ReferenceError`].
pub fn flight(source: Source<'_>) -> Result<ExactFlight, ReferenceError> {
    at_enough_bits(|bits| solve(&source.model(bits, None)?), ExactFlight::agrees).map(|([_, flight], _)| flight)
}

/// The critical velocity of `source` to 50 digits; its impact speed is not used.
///
/// # Errors
/// [`ReferenceError`].
pub fn critical(source: Source<'_>) -> Result<ExactCritical, ReferenceError> {
    let ([_, critical], _) = at_enough_bits(
        |bits| squared_critical(source, bits, None).map(|(mass, squared)| [squared.sqrt(), half(mass * squared)]),
        |a, b| a.iter().zip(b).all(|(a, b)| agree(a, b)),
    )?;
    let [velocity, energy] = critical.map(Exact);
    Ok(ExactCritical { velocity, energy })
}

/// Condition numbers of the flight of `source` with respect to all its inputs.
///
/// Infinite where a step of 2^-80 in an input changes the outcome or the list of events.
///
/// # Errors
/// [`ReferenceError`].
pub fn conditions(source: Source<'_>) -> Result<Conditions, ReferenceError> {
    let ([base, _], bits) = at_enough_bits(|bits| solve(&source.model(bits, None)?), ExactFlight::agrees)?;
    let mut sums = [0.0; 5];
    for input in source.moving_inputs()? {
        let moved = solve(&source.model(bits, Some(input))?)?;
        if !moved.same_course(&base) {
            let at_crater_end = if base.crater_end().is_some() { f64::INFINITY } else { 0.0 };
            return Ok([f64::INFINITY, f64::INFINITY, f64::INFINITY, at_crater_end, at_crater_end]);
        }
        for (sum, term) in sums.iter_mut().zip(quotients(&moved, &base)) {
            *sum += term;
        }
    }
    Ok(sums)
}

/// The terms of [`Conditions`] for one input; zero for what the flights do not have.
fn quotients(moved: &ExactFlight, base: &ExactFlight) -> [f64; 5] {
    let of = |moved: &Exact, base: &Exact, scale: &Exact| quotient(&moved.0 - &base.0, &scale.0, STEP_BITS);
    let at = |moved: &ExactState, state: &ExactState| {
        let velocity = of(&moved.velocity, &state.velocity, &base.impact_speed);
        [of(&moved.depth, &state.depth, &state.depth), of(&moved.time, &state.time, &state.time), velocity]
    };
    let [depth, time, velocity] = at(&moved.end, &base.end);
    let crater_ends = moved.crater_end().zip(base.crater_end());
    let [_, crater_end_time, crater_end_velocity] = crater_ends.map_or([0.0; 3], |(moved, base)| at(moved, base));
    [depth, time, velocity, crater_end_time, crater_end_velocity]
}

/// Condition number of the critical velocity of `source` with respect to all its inputs.
///
/// # Errors
/// [`ReferenceError`].
pub fn critical_condition(source: Source<'_>) -> Result<f64, ReferenceError> {
    let velocity = |bits, moved| squared_critical(source, bits, moved).map(|(_, squared)| squared.sqrt());
    let ([base, _], bits) = at_enough_bits(|bits| velocity(bits, None), agree)?;
    let mut sum = 0.0;
    for input in source.moving_inputs()? {
        sum += quotient(velocity(bits, Some(input))? - &base, &base, STEP_BITS);
    }
    Ok(sum)
}

/// `2^bits |difference/scale|`: zero without a difference, else infinite without a scale.
fn quotient(difference: Big, scale: &Big, bits: isize) -> f64 {
    if is_zero(&difference) {
        0.0
    } else if is_zero(scale) {
        f64::INFINITY
    } else {
        ((magnitude(difference) / magnitude(scale.clone())) << bits).to_f64().value()
    }
}

/// Raises the precision until two attempts agree: both, and the bits of the first. Its 52 digits leave 28 to a difference
/// quotient with a step of 2^-80.
fn at_enough_bits<T>(
    attempt: impl Fn(usize) -> Result<T, ReferenceError>,
    agree: impl Fn(&T, &T) -> bool,
) -> Result<([T; 2], usize), ReferenceError> {
    let mut bits = FIRST_BITS;
    let mut last = attempt(bits)?;
    for _ in 0..ATTEMPTS {
        let more = bits + bits / 2;
        let next = attempt(more)?;
        if agree(&last, &next) {
            return Ok(([last, next], bits));
        }
        (last, bits) = (next, more);
    }
    Err(ReferenceError::Undecided(bits))
}

fn agree(a: &Big, b: &Big) -> bool {
    let difference = magnitude(a - b);
    is_zero(&difference) || (difference << AGREEMENT_BITS) < magnitude(b.clone())
}

// Big floats: the few words that the formulas below are written in.

fn big(value: f64, bits: usize) -> Big {
    assert!(value.is_finite(), "a reference input is finite: {value}");
    Big::try_from(value).unwrap_or(Big::ZERO).with_precision(bits).value()
}

fn int(value: i32, bits: usize) -> Big {
    big(f64::from(value), bits)
}

fn is_finite(value: &Big) -> bool {
    *value < Big::INFINITY
}

fn is_zero(value: &Big) -> bool {
    *value == Big::ZERO
}

fn is_positive(value: &Big) -> bool {
    *value > Big::ZERO
}

fn is_negative(value: &Big) -> bool {
    *value < Big::ZERO
}

fn magnitude(value: Big) -> Big {
    if is_negative(&value) { -value } else { value }
}

fn half(value: Big) -> Big {
    value >> 1
}

fn twice(value: Big) -> Big {
    value << 1
}

fn square(value: &Big) -> Big {
    value * value
}

/// Natural logarithm: sixteen square roots bring the argument near one, where the series is short (35 us become 4).
fn ln(value: &Big) -> Big {
    let mut root = value.clone();
    for _ in 0..16 {
        root = root.sqrt();
    }
    (root - Big::ONE).ln_1p() << 16
}

/// Arc tangent, by `atan z = 2 atan(z/(1 + sqrt(1 + z²)))` twelve times for a short series.
fn atan(value: &Big) -> Big {
    let mut z = value.clone();
    for _ in 0..12 {
        let hypotenuse = (Big::ONE + square(&z)).sqrt();
        z /= Big::ONE + hypotenuse;
    }
    z.atan() << 12
}

/// Angle of the point (`x`, `y`), in -pi to pi.
fn atan2(y: &Big, x: &Big, bits: usize) -> Big {
    if is_positive(x) {
        return atan(&(y / x));
    }
    let right = half(Big::pi(bits));
    let right = if is_negative(y) { -right } else { right };
    if is_zero(y) { twice(right) } else { right - atan(&(x / y)) }
}

/// Whether `value`, a difference of terms of magnitude `size`, is zero as far as `bits` resolve it: half of them.
fn vanishes(value: &Big, size: &Big, bits: usize) -> bool {
    (magnitude(value.clone()) << (bits / 2).cast_signed()) <= *size
}

/// A problem in big floats; a depth that it does not have is infinite.
struct Model {
    bits: usize,
    problem: Problem<Big>,
}

/// Place of the impact speed among the inputs of either source.
const IMPACT_SPEED: usize = 1;

/// The numbers of a source as they are read, one of them moved by a relative 2^-80 where that is asked for.
struct Inputs {
    bits: usize,
    moved: Option<usize>,
    /// Those read so far, without infinite ones.
    values: Vec<f64>,
}

impl Inputs {
    fn number(&mut self, value: f64) -> Big {
        if value.is_infinite() {
            return Big::INFINITY;
        }
        let exact = big(value, self.bits);
        let moves = self.moved == Some(self.values.len());
        self.values.push(value);
        if moves { &exact + (exact.clone() >> STEP_BITS) } else { exact }
    }

    fn stages(&mut self, stages: &[Stage]) -> Stages<Big> {
        stages.iter().map(|stage| stage.map(|value| self.number(value))).collect()
    }
}

impl Source<'_> {
    /// The inputs that are not zero, by their places.
    fn moving_inputs(self) -> Result<Vec<usize>, ReferenceError> {
        let mut inputs = Inputs { bits: FIRST_BITS, moved: None, values: Vec::new() };
        self.read(&mut inputs)?;
        Ok((0..inputs.values.len()).filter(|&i| inputs.values[i] != 0.0).collect())
    }

    /// The problem with `bits` bits, the input at the place `moved` moved by a relative 2^-80.
    fn model(self, bits: usize, moved: Option<usize>) -> Result<Model, ReferenceError> {
        Ok(Model { bits, problem: self.read(&mut Inputs { bits, moved, values: Vec::new() })? })
    }

    fn read(self, inputs: &mut Inputs) -> Result<Problem<Big>, ReferenceError> {
        let own = match self {
            Self::Problem(problem) => (0..problem.stages.len()).find(|&index| problem.laws.of(index).is_some()),
            Self::Scene(scene, _) => {
                let is_law = |(_, force): &&(usize, Force)| !matches!(force, Force::Table(_));
                let plug = (scene.criterion == Criterion::Plug).then_some(0);
                let end = scene.ends.first().map(|(stage, _)| *stage).or(plug);
                scene.forces.iter().find(is_law).map(|(stage, _)| *stage).or(end)
            }
        };
        if let Some(stage) = own {
            return Err(ReferenceError::Unsupported { stage, why: "it has a law of its own" });
        }
        let [mass, impact_speed] = match self {
            Self::Problem(problem) => [problem.mass, problem.impact_speed],
            Self::Scene(scene, impact_speed) => [scene.mass, impact_speed],
        }
        .map(|value| inputs.number(value));
        let exit_depth = inputs.number(match self {
            Self::Problem(problem) => problem.exit_depth,
            Self::Scene(scene, _) => scene.thickness.unwrap_or(f64::INFINITY),
        });
        let (scene, concrete) = match self {
            Self::Problem(&Problem { ref stages, crater, target, .. }) => {
                let stages = inputs.stages(stages);
                return Ok(Problem { mass, impact_speed, exit_depth, stages, crater, target, laws: Laws::none() });
            }
            Self::Scene(Scene { forces, .. }, _) if !forces.is_empty() => {
                return Err(ReferenceError::Scene("it has a table of a force; give the problem it resolves into"));
            }
            Self::Scene(Scene { resistance: Resistance::Stages(stages), .. }, _) => {
                let stages = inputs.stages(stages);
                return Ok(Problem {
                    mass,
                    impact_speed,
                    exit_depth,
                    stages,
                    crater: None,
                    target: Target::Stages,
                    laws: Laws::none(),
                });
            }
            Self::Scene(scene @ Scene { resistance: Resistance::Concrete(concrete), .. }, _) => (scene, concrete),
        };
        if !concrete.layers.is_empty() {
            return Err(ReferenceError::Scene("it has layers; give the problem it resolves into"));
        }
        let [d, nose, strength, density, static_factor, inertia_factor, k] = [
            concrete.diameter,
            concrete.nose_factor,
            concrete.strength,
            concrete.density,
            concrete.static_factor,
            concrete.inertia_factor,
            concrete.crater_ratio,
        ]
        .map(|value| inputs.number(value));
        let area = Big::pi(inputs.bits) * square(&d) / int(4, inputs.bits);
        let p = &area * static_factor * strength;
        let q = area * nose * inertia_factor * density;
        let kd = k * &d;
        let exit_depth = match scene.criterion {
            Criterion::Ndrc if scene.thickness.is_some() => ndrc_depth(&exit_depth, &d, inputs.bits),
            _ => exit_depth,
        };
        let law =
            |static_force, stiffness, drag, end| Stage { static_force, stiffness, viscosity: Big::ZERO, drag, end };
        let mut stages = Stages::new();
        let crater = is_positive(&kd).then_some(0);
        if crater.is_some() {
            let stiffness = match concrete.crater_stiffness {
                CraterStiffness::Given(stiffness) => inputs.number(stiffness),
                // From c k d = P + Q V1² and M V1² = M V0² - c (k d)².
                CraterStiffness::Continuous => {
                    let work = &mass * (&p + &q * square(&impact_speed));
                    work / (&kd * (&mass + &kd * &q))
                }
            };
            stages.push(law(Big::ZERO, stiffness, Big::ZERO, kd));
        }
        stages.push(law(p, Big::ZERO, q, Big::INFINITY));
        Ok(Problem {
            mass,
            impact_speed,
            exit_depth,
            stages,
            crater,
            target: Target::CraterAndTunnel,
            laws: Laws::none(),
        })
    }
}

/// Penetration that perforates thickness `h` by the ACE/NDRC relation (docs/theory.md, section 4): its first branch, the
/// smaller depth, as far as that goes.
fn ndrc_depth(h: &Big, d: &Big, bits: usize) -> Big {
    let ratio = |numerator, denominator| int(numerator, bits) / int(denominator, bits);
    let e = h / d;
    // 3.19 y - 0.718 y² at its end y = 1.35.
    let first_end = ratio(319, 100) * ratio(135, 100) - ratio(718, 1000) * square(&ratio(135, 100));
    let y = if e <= first_end {
        let (b, a) = (ratio(319, 100), ratio(718, 1000));
        (&b - (square(&b) - int(4, bits) * &a * e).sqrt()) / twice(a)
    } else {
        (e - ratio(132, 100)) / ratio(124, 100)
    };
    y * d
}

/// A state at one precision.
type Point = State<Big>;

fn exact(Point { time, depth, velocity }: &Point) -> ExactState {
    State { time: Exact(time.clone()), depth: Exact(depth.clone()), velocity: Exact(velocity.clone()) }
}

impl Model {
    /// Where stage `index` is left: its end or the exit; none when there is neither.
    fn limit(&self, index: usize) -> Option<&Big> {
        let (end, exit) = (&self.problem.stages[index].end, &self.problem.exit_depth);
        Some(if exit < end { exit } else { end }).filter(|limit| is_finite(limit))
    }
}

/// Solves the model.
fn solve(model: &Model) -> Result<ExactFlight, ReferenceError> {
    let (problem, zero) = (&model.problem, int(0, model.bits));
    let mut now = Point { time: zero.clone(), depth: zero.clone(), velocity: problem.impact_speed.clone() };
    let mut events: Vec<ExactEvent> = Vec::new();
    let mut solved_last = None;
    let finish = |outcome, stage, end: Point, events: Vec<ExactEvent>| {
        let exit_margin = margin(model, outcome, stage, &end, &events).map(Exact);
        let impact_speed = Exact(problem.impact_speed.clone());
        ExactFlight { outcome, stage, end: exact(&end), events, exit_margin, impact_speed }
    };
    for (index, law) in problem.stages.iter().enumerate() {
        let limit = model.limit(index);
        if limit.is_none_or(|limit| *limit > now.depth) {
            let mut rests = is_zero(&now.velocity);
            if !rests {
                (now, rests) = through(model, index, &now)?;
                solved_last = Some(index);
            }
            if rests {
                events.push(Event { kind: EventKind::Rest, state: exact(&now) });
                let stage = solved_last.unwrap_or(index);
                return Ok(finish(problem.stop_in(stage), stage, now, events));
            }
        }
        if limit == Some(&law.end) {
            // Even at the exit: the last stage there, which has no length, does that, so that every end is listed before.
            events.push(Event { kind: EventKind::boundary(problem, index), state: exact(&now) });
        } else if limit.is_some() {
            events.push(Event { kind: EventKind::Exit, state: exact(&now) });
            if is_zero(&now.velocity) {
                events.push(Event { kind: EventKind::Rest, state: exact(&now) });
            }
            return Ok(finish(Outcome::Perforated, solved_last.unwrap_or(index), now, events));
        }
    }
    Err(ReferenceError::NeverEnds)
}

/// One stage: the point at its limit and `false`, or the point of rest and `true`.
fn through(model: &Model, index: usize, from: &Point) -> Result<(Point, bool), ReferenceError> {
    let (law, limit) = (&model.problem.stages[index], model.limit(index));
    if is_positive(&law.viscosity) {
        if is_positive(&law.drag) {
            return Err(ReferenceError::Unsupported { stage: index, why: "viscosity and drag act together" });
        }
        return damped(model, law, from, limit);
    }
    // Without viscosity W over x decides. In a resisting or driven stage alike W >= 0 at the limit means W > 0 before.
    let bits = model.bits;
    if let Some(limit) = limit {
        let (gain, loss) =
            squared_speed_terms(law, &model.problem.mass, &square(&from.velocity), &from.depth, limit, bits);
        let w = &gain - &loss;
        let touches = vanishes(&w, &(magnitude(gain) + magnitude(loss)), bits);
        if touches || is_positive(&w) {
            let velocity = if touches { int(0, bits) } else { w.sqrt() };
            let time = &from.time + passage_time(model, law, from, limit, &velocity)?;
            return Ok((Point { time, depth: limit.clone(), velocity }, false));
        }
    }
    let depth = rest_depth(model, law, from)?;
    let velocity = int(0, bits);
    let time = &from.time + passage_time(model, law, from, &depth, &velocity)?;
    Ok((Point { time, depth, velocity }, true))
}

/// W at `to` as gain minus loss, `w` at `from` taken through a stage without viscosity.
fn squared_speed_terms(law: &Stage<Big>, mass: &Big, w: &Big, from: &Big, to: &Big, bits: usize) -> (Big, Big) {
    let Stage { static_force: p, stiffness: s, drag: q, .. } = law;
    if is_zero(q) {
        let work = p * (to - from) + half(s * (square(to) - square(from)));
        return (w.clone(), twice(work) / mass);
    }
    // W_p = s M/(2 q²) - (p + s x)/q solves W' = -2 (p + s x + q W)/M.
    let particular = |x: &Big| half(s * mass) / square(q) - (p + s * x) / q;
    let decay = (-(twice(q * (to - from)) / mass)).with_precision(bits).value().exp();
    (w * &decay, particular(from) * decay - particular(to))
}

/// W at `to`, of the terms of [`squared_speed_terms`].
fn squared_speed(law: &Stage<Big>, mass: &Big, w: &Big, from: &Big, to: &Big, bits: usize) -> Big {
    let (gain, loss) = squared_speed_terms(law, mass, w, from, to, bits);
    gain - loss
}

/// Depth of rest in a stage without viscosity and without a limit.
fn rest_depth(model: &Model, law: &Stage<Big>, from: &Point) -> Result<Big, ReferenceError> {
    let Stage { static_force: p, stiffness: s, drag: q, .. } = law;
    let (mass, w0, bits) = (&model.problem.mass, square(&from.velocity), model.bits);
    match (is_positive(s), is_positive(q)) {
        // From V² - w² u² constant, w² = -s/M; u = 0 is at most approached.
        (false, _) if is_negative(s) => {
            let left = square(&(&from.depth + p / s)) + w0 * mass / s;
            if is_positive(&left) { Ok(-left.sqrt() - p / s) } else { Err(ReferenceError::NeverEnds) }
        }
        (false, _) if !is_positive(p) => Err(ReferenceError::NeverEnds),
        (false, false) => Ok(&from.depth + mass * w0 / twice(p.clone())),
        (false, true) => Ok(&from.depth + mass / twice(q.clone()) * ln(&(int(1, bits) + q * w0 / p))),
        (true, drags) => {
            let u0 = &from.depth + p / s;
            let without_drag = (square(&u0) + &w0 * mass / s).sqrt() - p / s;
            if !drags {
                return Ok(without_drag);
            }
            Ok(root(&from.depth, &without_drag, bits, |x| {
                let w = squared_speed(law, mass, &w0, &from.depth, x, bits);
                let slope = twice(p + s * x + q * &w) / mass;
                // W falls through zero: turned over to rise.
                (-w, slope)
            }))
        }
    }
}

/// Time from `from` to depth `to`, where the speed is `velocity`, in a stage without viscosity.
fn passage_time(
    model: &Model,
    law: &Stage<Big>,
    from: &Point,
    to: &Big,
    velocity: &Big,
) -> Result<Big, ReferenceError> {
    let Stage { static_force: p, stiffness: s, drag: q, .. } = law;
    let (mass, bits, v0) = (&model.problem.mass, model.bits, &from.velocity);
    let xi = to - &from.depth;
    if is_zero(&xi) {
        return Ok(int(0, bits));
    }
    Ok(match (is_positive(s), is_positive(q)) {
        (false, _) if is_negative(s) => return exponential_time(model, law, from, to, velocity),
        (true, false) => {
            let w = (s / mass).sqrt();
            let phase = |x: &Big, v: &Big| atan2(&(&w * (x + p / s)), v, bits);
            (phase(to, velocity) - phase(&from.depth, v0)) / w
        }
        (true, true) => quadrature(model, law, from, to),
        (false, false) if is_zero(p) => xi / v0,
        (false, false) => mass * (v0 - velocity) / p,
        (false, true) if is_zero(p) => mass / q * (int(1, bits) / velocity - int(1, bits) / v0),
        (false, true) if is_positive(p) => {
            let scale = (q / p).sqrt();
            let angle = |v: &Big| atan(&(v * &scale));
            mass / (p * q).sqrt() * (angle(v0) - angle(velocity))
        }
        (false, true) => {
            // Partial fractions of dV/(Vt² - V²), with V² - Vt² = (V0² - Vt²) e^{-y} put in: it drowns in Vt² otherwise.
            let terminal = (-(p / q)).sqrt();
            let faster = (velocity + &terminal) / (v0 + &terminal);
            xi / &terminal + mass / (q * terminal) * ln(&faster)
        }
    })
}

/// [`passage_time`] where the force falls with depth: of `V + w u`, which grows as `e^{w t}`, and `V - w u`, which falls as
/// `e^{-w t}`, `w² = -s/M` and `u = x + p/s`, the one that is farther from zero.
fn exponential_time(
    model: &Model,
    law: &Stage<Big>,
    from: &Point,
    to: &Big,
    velocity: &Big,
) -> Result<Big, ReferenceError> {
    let Stage { static_force: p, stiffness: s, .. } = law;
    let w = (-(s / &model.problem.mass)).sqrt();
    let [u0, u] = [&from.depth, to].map(|x| &w * (x + p / s));
    let (first, last) =
        if is_negative(&u) { (&from.velocity - u0, velocity - u) } else { (velocity + u, &from.velocity + u0) };
    if !is_positive(&last) {
        return Err(ReferenceError::NeverEnds);
    }
    Ok(ln(&(first / last)) / w)
}

/// `∫ dx/V` by the tanh-sinh rule, whose double exponential swallows the root of W at rest.
///
/// With `x = a + (b - a) z`, `z = 1/(1 + e^{-2 sigma})`, `sigma = (pi/2) sinh(h j)`. W near its zero is a difference,
/// which costs the time of rest half of its bits: the attempts with more of them make up for it.
fn quadrature(model: &Model, law: &Stage<Big>, from: &Point, to: &Big) -> Big {
    let bits = model.bits;
    let one = int(1, bits);
    let length = to - &from.depth;
    let squared = square(&from.velocity);
    let half_pi = half(Big::pi(bits));
    // The rule's error is e^{-2 pi a/h}, with the distance a of the nearest singularity from the real axis at most pi/2
    // and less where W has its zero just beyond `to`. At |h j| = 5.5 the weights are below 2^-500.
    let steps = i32::try_from(bits / 8).unwrap_or(i32::MAX);
    let h = int(1, bits) / int(steps, bits);
    let mut sum = int(0, bits);
    // e^{h j} and e^{-h j}: each product costs a rounding, hundreds of them eight bits.
    let [rise, fall] = [h.exp(), (-h.clone()).exp()];
    let first = -(steps * 11 / 2);
    let [mut next_grow, mut next_shrink] = [int(first, bits) * &h, int(-first, bits) * &h].map(|at| at.exp());
    for _ in first..=-first {
        let (grow, shrink) = (next_grow, next_shrink);
        (next_grow, next_shrink) = (&grow * &rise, &shrink * &fall);
        let sigma = &half_pi * half(&grow - &shrink);
        let far = twice(sigma).exp();
        let near_end = &one / (&one + &far);
        let z = &far * &near_end;
        let x = &from.depth + &length * &z;
        let w = squared_speed(law, &model.problem.mass, &squared, &from.depth, &x, bits);
        if !is_positive(&w) {
            continue;
        }
        // dz/dj = z (1 - z) 2 sigma'.
        let weight = z * near_end * twice(&half_pi * half(grow + shrink)) * &h;
        sum += weight / w.sqrt();
    }
    sum * length
}

/// The linear motion under `p + s x + r V`, counted from the entry of the stage.
enum Linear {
    /// s = 0: the speed decays at `rate = r/M` towards `-drift`, `drift = p/r`.
    Drift { start: Big, speed: Big, rate: Big, drift: Big },
    /// s > 0: a damped oscillator about `-p/s`, as `u = x + p/s` from `u0` and V0.
    Oscillator { centre: Big, u0: Big, v0: Big, g: Big, m: Big, brake: Big, damping: Ordering },
}

impl Linear {
    fn new(law: &Stage<Big>, mass: &Big, from: &Point, bits: usize) -> Self {
        let Stage { static_force: p, stiffness: s, viscosity: r, .. } = law;
        if is_zero(s) {
            let (start, speed) = (from.depth.clone(), from.velocity.clone());
            return Self::Drift { start, speed, rate: r / mass, drift: p / r };
        }
        let centre = p / s;
        let u0 = &from.depth + &centre;
        let g = half(r / mass);
        // Exact, as products of 64-bit inputs fit: critical damping is seen as such.
        let discriminant = square(r) - int(4, bits) * s * mass;
        let damping = discriminant.cmp(&Big::ZERO);
        let m = half(magnitude(discriminant).sqrt() / mass);
        let brake = &g * &from.velocity + s / mass * &u0;
        Self::Oscillator { centre, u0, v0: from.velocity.clone(), g, m, brake, damping }
    }

    /// Depth and speed after time `t`.
    fn after(&self, t: &Big) -> (Big, Big) {
        match self {
            Self::Drift { start, speed, rate, drift } => {
                let decay = (-(rate * t)).exp();
                let fall = speed + drift;
                (start - drift * t + &fall * (Big::ONE - &decay) / rate, fall * decay - drift)
            }
            Self::Oscillator { centre, u0, v0, g, m, brake, damping } => {
                // e^{-g t} times cos m t and sin(m t)/m, or their critical or hyperbolic counterparts.
                let (cosine, sine) = match damping {
                    Ordering::Less => {
                        let decay = (-(g * t)).exp();
                        let (sine, cosine) = (m * t).sin_cos();
                        (&decay * cosine, decay * sine / m)
                    }
                    Ordering::Equal => {
                        let decay = (-(g * t)).exp();
                        (decay.clone(), decay * t)
                    }
                    Ordering::Greater => {
                        let (slow, fast) = ((-((g - m) * t)).exp(), (-((g + m) * t)).exp());
                        (half(&slow + &fast), half(slow - fast) / m)
                    }
                };
                (u0 * &cosine + (v0 + g * u0) * &sine - centre, v0 * cosine - brake * sine)
            }
        }
    }

    /// When it rests, if ever.
    fn rest_time(&self, bits: usize) -> Option<Big> {
        match self {
            Self::Drift { speed, rate, drift, .. } => {
                is_positive(drift).then(|| ln(&(int(1, bits) + speed / drift)) / rate)
            }
            Self::Oscillator { v0, m, brake, damping, .. } => match damping {
                Ordering::Less => Some(atan2(&(m * v0), brake, bits) / m),
                Ordering::Equal => is_positive(brake).then(|| v0 / brake),
                Ordering::Greater => {
                    let slow_brake = brake - m * v0;
                    is_positive(&slow_brake).then(|| ln(&((brake + m * v0) / slow_brake)) / twice(m.clone()))
                }
            },
        }
    }

    /// The depth that a motion without rest only approaches; none when it goes on for ever.
    fn horizon(&self) -> Option<Big> {
        match self {
            Self::Drift { start, speed, rate, drift } => is_zero(drift).then(|| start + speed / rate),
            Self::Oscillator { centre, .. } => Some(-centre.clone()),
        }
    }
}

/// A stage `p + s x + r V`: the point at `limit` and `false`, or the point of rest and `true`.
fn damped(model: &Model, law: &Stage<Big>, from: &Point, limit: Option<&Big>) -> Result<(Point, bool), ReferenceError> {
    let bits = model.bits;
    let motion = Linear::new(law, &model.problem.mass, from, bits);
    let rest = motion.rest_time(bits);
    if let Some(rest) = &rest {
        let (depth, _) = motion.after(rest);
        let touched = limit.filter(|limit| vanishes(&(&depth - *limit), limit, bits));
        if touched.is_some() || limit.is_none_or(|limit| depth < *limit) {
            let rests_inside = touched.is_none();
            let depth = touched.cloned().unwrap_or(depth);
            return Ok((Point { time: &from.time + rest, depth, velocity: int(0, bits) }, rests_inside));
        }
    }
    let limit = limit.ok_or(ReferenceError::NeverEnds)?;
    if rest.is_none() && motion.horizon().is_some_and(|horizon| horizon <= *limit) {
        return Err(ReferenceError::NeverEnds);
    }
    let mut high = rest.unwrap_or_else(|| (limit - &from.depth) / &from.velocity);
    // 2^100 times free flight is beyond any of the rates; the loop ends because the limit lies before the horizon.
    for _ in 0..100 {
        if motion.after(&high).0 >= *limit {
            break;
        }
        high = twice(high);
    }
    let time = root(&int(0, bits), &high, bits, |t| {
        let (depth, speed) = motion.after(t);
        (depth - limit, speed)
    });
    let velocity = motion.after(&time).1;
    Ok((Point { time: &from.time + time, depth: limit.clone(), velocity }, false))
}

/// The root of a rising function between `low` and `high`: Newton steps in a bracket that shrinks, else halving.
fn root(low: &Big, high: &Big, bits: usize, value_and_slope: impl Fn(&Big) -> (Big, Big)) -> Big {
    let (mut low, mut high) = (low.clone(), high.clone());
    let mut at = half(&low + &high);
    for _ in 0..4 * bits {
        let (value, slope) = value_and_slope(&at);
        if is_zero(&value) {
            return at;
        }
        if is_negative(&value) {
            low.clone_from(&at);
        } else {
            high.clone_from(&at);
        }
        let newton = if is_zero(&slope) { high.clone() } else { &at - value / slope };
        let next = if newton > low && newton < high { newton } else { half(&low + &high) };
        let step = magnitude(&next - &at);
        at = next;
        // The last eight bits are the function's own round-off.
        if is_zero(&step) || (step << (bits - 8).cast_signed()) < magnitude(at.clone()) {
            return at;
        }
    }
    at
}

/// The exit margin: least W over the stage ends ahead and the exit, over V0².
fn margin(model: &Model, outcome: Outcome, stage: usize, end: &Point, events: &[ExactEvent]) -> Option<Big> {
    let Problem { mass, impact_speed, exit_depth, stages, .. } = &model.problem;
    if !is_finite(exit_depth) || is_zero(impact_speed) {
        return None;
    }
    let scale = square(impact_speed);
    let mut least: Option<Big> = None;
    let mut take = |w: Big| {
        if least.as_ref().is_none_or(|least| w < *least) {
            least = Some(w);
        }
    };
    if outcome == Outcome::Perforated {
        for Event { kind, state } in events {
            if *kind != EventKind::Rest {
                take(square(&state.velocity.0));
            }
        }
    } else {
        let (mut w, mut from) = (int(0, model.bits), end.depth.clone());
        for (index, law) in stages.iter().enumerate().skip(stage) {
            let to = model.limit(index)?.clone();
            if is_positive(&law.viscosity) {
                let work = &law.static_force * (&to - &from) + half(&law.stiffness * (square(&to) - square(&from)));
                w -= twice(work) / mass;
            } else {
                w = squared_speed(law, mass, &w, &from, &to, model.bits);
            }
            take(w.clone());
            from = to;
            if law.end >= *exit_depth {
                break;
            }
        }
    }
    least.map(|w| w / scale)
}

/// Mass and `V_c²`: W at each stage end up to the exit is affine in V0², and none may be below zero.
fn squared_critical(source: Source<'_>, bits: usize, moved: Option<usize>) -> Result<(Big, Big), ReferenceError> {
    // The models at V0² = 0 and 1: only a continuous crater differs.
    let at = |impact_speed| {
        let source = match source {
            Source::Scene(scene, _) => Source::Scene(scene, impact_speed),
            problem @ Source::Problem(_) => problem,
        };
        source.model(bits, moved.filter(|input| *input != IMPACT_SPEED))
    };
    let (model, moved) = (at(0.0)?, at(1.0)?);
    let Problem { mass, exit_depth, stages, .. } = &model.problem;
    if !is_finite(exit_depth) {
        return Err(ReferenceError::NoCritical);
    }
    // W = w + slope V0² at depth `from`.
    let (mut w, mut slope, mut from) = (int(0, bits), int(1, bits), int(0, bits));
    let mut squared = int(0, bits);
    for (index, (law, moved_law)) in stages.iter().zip(&moved.problem.stages).enumerate() {
        let to = model.limit(index).ok_or(ReferenceError::NoCritical)?;
        if *to > from {
            if is_positive(&law.viscosity) {
                return Err(ReferenceError::NoCritical);
            }
            let beyond = |law: &Stage<Big>, w: &Big| squared_speed(law, mass, w, &from, to, bits);
            // Only the continuous crater needs the difference, in which a slope of e^{-y} would drown.
            slope = if law.stiffness == moved_law.stiffness {
                slope * (-(twice(&law.drag * (to - &from)) / mass)).exp()
            } else {
                beyond(moved_law, &(&w + slope)) - beyond(law, &w)
            };
            w = beyond(law, &w);
            from.clone_from(to);
            let demand = -(&w / &slope);
            if demand > squared {
                squared = demand;
            }
        }
        if law.end >= *exit_depth {
            break;
        }
    }
    Ok((mass.clone(), squared))
}

#[cfg(test)]
mod tests;
