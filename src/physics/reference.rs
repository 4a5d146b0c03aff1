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
//! p, r   V = (V0 + p/r) e^{-r t/M} - p/r                          x(t) its integral, inverted by root finding
//! p, s, r  u = A e^{-l1 t} + B e^{-l2 t}, or damped sine           the same
//! p, s, q  W = W_p(x) + (V0² - W_p(x0)) e^{-y},  W_p = s M/(2 q²) - (p + s x)/q;   t = ∫ dx/V by quadrature
//! ```
//!
//! From a [`Scene`] it starts at the scene's own numbers (mass, diameter, strength ...), so that rounding in resolving
//! a scene counts as error too; from a [`Problem`] at its coefficients. Critical velocities come from W at the stage
//! ends being affine in V0², not from the formulas of theory section 2. Condition numbers are difference quotients
//! with a relative step of 2^-80, a step that only this precision can afford.

use std::cmp::Ordering;

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use thiserror::Error;

use super::event::{EventKind, Outcome};
use super::scene::{CraterStiffness, Criterion, Resistance, Scene};
use super::stage::{Problem, Target};

/// A binary float of any precision, rounding half to even.
type Big = FBig<HalfEven, 2>;

/// Bits of the first attempt: 77 decimal digits.
const FIRST_BITS: usize = 256;
/// Attempts before an answer is given up; the last has 6561 bits.
const ATTEMPTS: usize = 8;
/// Two attempts agree when they differ by less than 2^-AGREEMENT_BITS of the value: 52 digits.
const AGREEMENT_BITS: isize = 173;
/// Relative step of the difference quotients is 2^-STEP_BITS: their error is near 2^-80, of no account to a bar.
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
        if !value.is_finite() {
            return f64::INFINITY;
        }
        let difference = magnitude(big(value, FIRST_BITS) - &self.0);
        if is_zero(&difference) {
            0.0
        } else if is_zero(&scale.0) {
            f64::INFINITY
        } else {
            (difference / magnitude(scale.0.clone())).to_f64().value()
        }
    }

    /// Decimal digits, `digits` significant ones.
    pub fn to_decimal(&self, digits: usize) -> String {
        let decimal = self.0.to_decimal().value();
        decimal.with_precision(digits).value().to_string()
    }
}

/// A place and an instant to 50 digits.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactState {
    /// Time since impact [s].
    pub time: Exact,
    /// Depth from the impact face [m].
    pub depth: Exact,
    /// Velocity [m/s].
    pub velocity: Exact,
}

/// An event and its exact state.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactEvent {
    /// What happened.
    pub kind: EventKind,
    /// When, where and how fast.
    pub state: ExactState,
}

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
    /// Impact speed V0 [m/s], the scale of velocity errors.
    pub impact_speed: Exact,
}

impl ExactFlight {
    /// State at x = k d, if the flight reached it.
    pub fn crater_end(&self) -> Option<&ExactState> {
        self.events.iter().find(|e| e.kind == EventKind::CraterEnd).map(|e| &e.state)
    }
}

/// Critical velocity and energy to 50 digits.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactCritical {
    /// Critical velocity `V_c` [m/s].
    pub velocity: Exact,
    /// Critical energy `E_c = M V_c²/2` [J].
    pub energy: Exact,
}

/// Condition numbers: the sum over all inputs p of `|p df/dp|/|f|`, so that inputs off by one ulp each move f by no
/// more than so many ulps. Velocities and the margin are taken absolutely (over V0, over 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Of the depth at the end.
    pub depth: f64,
    /// Of the time of the end.
    pub time: f64,
    /// Of the velocity at the end, over V0.
    pub velocity: f64,
    /// Of the time at x = k d.
    pub crater_end_time: Option<f64>,
    /// Of the velocity at x = k d, over V0.
    pub crater_end_velocity: Option<f64>,
    /// Of the exit margin, absolute.
    pub exit_margin: Option<f64>,
}

/// Why there is no reference answer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The reference knows no solution of this stage.
    #[error("no reference for stage {stage}: {why}")]
    Unsupported {
        /// Index of the stage from 0.
        stage: usize,
        /// What stands in the way.
        why: &'static str,
    },
    /// Nothing stops the projectile and there is no far side.
    #[error("the flight never ends")]
    NeverEnds,
    /// There is no far side to perforate, or a viscous stage before it.
    #[error("there is no critical velocity")]
    NoCritical,
    /// The scene gives layers, or no impact speed where one is needed.
    #[error("the reference does not read this scene: {why}")]
    Scene {
        /// What it lacks.
        why: &'static str,
    },
    /// Two precisions never agreed: a tie finer than the numbers can tell.
    #[error("{bits} bits do not settle the answer")]
    Unsettled {
        /// Bits of the last attempt.
        bits: usize,
    },
}

/// Where the exact inputs come from.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a> {
    /// A problem's coefficients.
    Problem(&'a Problem),
    /// A scene's numbers, at this impact speed [m/s].
    Scene(&'a Scene, f64),
}

/// The flight of `source` to 50 digits.
///
/// # Errors
/// [`ReferenceError`].
pub fn flight(source: Source<'_>) -> Result<ExactFlight, ReferenceError> {
    settled(|bits| fly(&source.model(&source.inputs(bits), bits)?), Raw::agrees).map(|(raw, _)| raw.into_exact())
}

/// The critical velocity of `source` to 50 digits; its impact speed is not used.
///
/// # Errors
/// [`ReferenceError`].
pub fn critical(source: Source<'_>) -> Result<ExactCritical, ReferenceError> {
    let (critical, _) = settled(
        |bits| {
            squared_critical(source, &source.inputs(bits), bits)
                .map(|(mass, squared)| [squared.sqrt(), half(mass * squared)])
        },
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
    let (base, bits) = settled(|bits| fly(&source.model(&source.inputs(bits), bits)?), Raw::agrees)?;
    let crater = base.crater_end().is_some();
    let mut sum = Conditions {
        depth: 0.0,
        time: 0.0,
        velocity: 0.0,
        crater_end_time: crater.then_some(0.0),
        crater_end_velocity: crater.then_some(0.0),
        exit_margin: base.margin.is_some().then_some(0.0),
    };
    let add = |to: &mut Option<f64>, term: f64| {
        if let Some(to) = to {
            *to += term;
        }
    };
    for stepped in source.stepped_inputs(bits) {
        let moved = fly(&source.model(&stepped, bits)?)?;
        if !moved.same_course(&base) {
            let lost = f64::INFINITY;
            return Ok(Conditions {
                depth: lost,
                time: lost,
                velocity: lost,
                crater_end_time: crater.then_some(lost),
                crater_end_velocity: crater.then_some(lost),
                exit_margin: sum.exit_margin.map(|_| lost),
            });
        }
        sum.depth += quotient(&moved.end.depth, &base.end.depth, &base.end.depth);
        sum.time += quotient(&moved.end.time, &base.end.time, &base.end.time);
        sum.velocity += quotient(&moved.end.velocity, &base.end.velocity, &base.impact_speed);
        if let (Some(moved), Some(base_end)) = (moved.crater_end(), base.crater_end()) {
            add(&mut sum.crater_end_time, quotient(&moved.time, &base_end.time, &base_end.time));
            add(&mut sum.crater_end_velocity, quotient(&moved.velocity, &base_end.velocity, &base.impact_speed));
        }
        if let (Some(moved), Some(margin)) = (&moved.margin, &base.margin) {
            add(&mut sum.exit_margin, quotient(moved, margin, &int(1, bits)));
        }
    }
    Ok(sum)
}

/// Condition number of the critical velocity of `source` with respect to all its inputs.
///
/// # Errors
/// [`ReferenceError`].
pub fn critical_condition(source: Source<'_>) -> Result<f64, ReferenceError> {
    let velocity = |inputs: &[Big], bits| squared_critical(source, inputs, bits).map(|(_, squared)| squared.sqrt());
    let (base, bits) = settled(|bits| velocity(&source.inputs(bits), bits), agree)?;
    let mut sum = 0.0;
    for stepped in source.stepped_inputs(bits) {
        sum += quotient(&velocity(&stepped, bits)?, &base, &base);
    }
    Ok(sum)
}

/// `|moved - base|/(2^-80 |scale|)`.
fn quotient(moved: &Big, base: &Big, scale: &Big) -> f64 {
    let difference = magnitude(moved - base);
    if is_zero(&difference) {
        return 0.0;
    }
    if is_zero(scale) {
        return f64::INFINITY;
    }
    ((difference / magnitude(scale.clone())) << STEP_BITS).to_f64().value()
}

/// Raises the precision until two attempts agree; also gives the bits of the one returned.
fn settled<T>(
    attempt: impl Fn(usize) -> Result<T, ReferenceError>,
    agree: impl Fn(&T, &T) -> bool,
) -> Result<(T, usize), ReferenceError> {
    let mut bits = FIRST_BITS;
    let mut last = attempt(bits)?;
    for _ in 0..ATTEMPTS {
        bits += bits / 2;
        let next = attempt(bits)?;
        if agree(&last, &next) {
            return Ok((next, bits));
        }
        last = next;
    }
    Err(ReferenceError::Unsettled { bits })
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

/// Whether `value`, a difference of terms of magnitude `size`, is zero as far as `bits` can tell: half of them.
fn vanishes(value: &Big, size: &Big, bits: usize) -> bool {
    (magnitude(value.clone()) << (bits / 2).cast_signed()) <= *size
}

/// A stage's coefficients.
#[derive(Clone, Debug)]
struct Law {
    p: Big,
    s: Big,
    r: Big,
    q: Big,
    end: Option<Big>,
}

/// A problem in big floats.
struct Model {
    bits: usize,
    mass: Big,
    impact_speed: Big,
    exit: Option<Big>,
    stages: Vec<Law>,
    crater: Option<usize>,
    target: Target,
}

impl Source<'_> {
    /// Every number that goes in, in the order that [`Source::model`] reads them.
    fn inputs(&self, bits: usize) -> Vec<Big> {
        let mut list = Vec::new();
        match self {
            Self::Problem(problem) => {
                list.extend([problem.mass, problem.impact_speed]);
                list.extend(problem.has_exit().then_some(problem.exit_depth));
                for stage in &problem.stages {
                    list.extend([stage.static_force, stage.stiffness, stage.viscosity, stage.drag]);
                    list.extend(stage.end.is_finite().then_some(stage.end));
                }
            }
            Self::Scene(scene, impact_speed) => {
                list.extend([scene.mass, *impact_speed]);
                list.extend(scene.thickness);
                match &scene.resistance {
                    Resistance::Concrete(concrete) => {
                        list.extend([
                            concrete.diameter,
                            concrete.nose_factor,
                            concrete.strength,
                            concrete.density,
                            concrete.static_factor,
                            concrete.inertia_factor,
                            concrete.crater_ratio,
                        ]);
                        if let CraterStiffness::Given(stiffness) = concrete.crater_stiffness {
                            list.push(stiffness);
                        }
                    }
                    Resistance::Stages(stages) => {
                        for stage in stages {
                            list.extend([stage.static_force, stage.stiffness, stage.viscosity, stage.drag]);
                            list.extend(stage.end.is_finite().then_some(stage.end));
                        }
                    }
                }
            }
        }
        list.into_iter().map(|value| big(value, bits)).collect()
    }

    /// The inputs with one of them moved by a relative 2^-80, for each that is not zero.
    fn stepped_inputs(&self, bits: usize) -> impl Iterator<Item = Vec<Big>> {
        let inputs = self.inputs(bits);
        (0..inputs.len())
            .filter(|&i| !is_zero(&inputs[i]))
            .map(move_one(inputs.clone()))
            .collect::<Vec<_>>()
            .into_iter()
    }

    /// The problem that `inputs` describe.
    fn model(&self, inputs: &[Big], bits: usize) -> Result<Model, ReferenceError> {
        let short = ReferenceError::Scene { why: "inputs are missing" };
        let mut next = {
            let mut rest = inputs.iter();
            move || rest.next().cloned().ok_or_else(|| short.clone())
        };
        let mass = next()?;
        let impact_speed = next()?;
        let mut outright = |stages: &[super::stage::Stage], exit: bool| {
            let exit = if exit { Some(next()?) } else { None };
            let mut laws = Vec::with_capacity(stages.len());
            for stage in stages {
                let (p, s, r, q) = (next()?, next()?, next()?, next()?);
                let end = if stage.end.is_finite() { Some(next()?) } else { None };
                laws.push(Law { p, s, r, q, end });
            }
            Ok((exit, laws))
        };
        match self {
            Self::Problem(problem) => {
                let (exit, stages) = outright(&problem.stages, problem.has_exit())?;
                Ok(Model { bits, mass, impact_speed, exit, stages, crater: problem.crater, target: problem.target })
            }
            Self::Scene(Scene { resistance: Resistance::Stages(stages), thickness, .. }, _) => {
                let (exit, stages) = outright(stages, thickness.is_some())?;
                Ok(Model { bits, mass, impact_speed, exit, stages, crater: None, target: Target::Stages })
            }
            Self::Scene(Scene { resistance: Resistance::Concrete(concrete), thickness, criterion, .. }, _) => {
                if !concrete.layers.is_empty() {
                    return Err(ReferenceError::Scene { why: "it has layers; give the problem it resolves into" });
                }
                let thickness = if thickness.is_some() { Some(next()?) } else { None };
                let (d, nose, strength, density) = (next()?, next()?, next()?, next()?);
                let (static_factor, inertia_factor, k) = (next()?, next()?, next()?);
                let area = Big::pi(bits) * square(&d) / int(4, bits);
                let p = &area * static_factor * strength;
                let q = area * nose * inertia_factor * density;
                let kd = k * &d;
                let exit = match criterion {
                    Criterion::FullDepth => thickness,
                    Criterion::Ndrc => thickness.map(|h| ndrc_depth(&h, &d, bits)),
                };
                let mut stages = Vec::with_capacity(2);
                let crater = is_positive(&kd).then_some(0);
                if crater.is_some() {
                    let s = match concrete.crater_stiffness {
                        CraterStiffness::Given(_) => next()?,
                        // From c k d = P + Q V1² and M V1² = M V0² - c (k d)².
                        CraterStiffness::Continuous => {
                            let work = &mass * (&p + &q * square(&impact_speed));
                            work / (&kd * (&mass + &kd * &q))
                        }
                    };
                    stages.push(Law { p: Big::ZERO, s, r: Big::ZERO, q: Big::ZERO, end: Some(kd) });
                }
                stages.push(Law { p, s: Big::ZERO, r: Big::ZERO, q, end: None });
                Ok(Model { bits, mass, impact_speed, exit, stages, crater, target: Target::CraterAndTunnel })
            }
        }
    }
}

/// Steps input `i` of a copy of `inputs`.
fn move_one(inputs: Vec<Big>) -> impl Fn(usize) -> Vec<Big> {
    move |i| {
        let mut moved = inputs.clone();
        moved[i] = &inputs[i] + (inputs[i].clone() >> STEP_BITS);
        moved
    }
}

/// Penetration that perforates thickness `h` by the ACE/NDRC relation (theory section 4): its first branch, the
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

/// Time, depth, velocity.
#[derive(Clone)]
struct Point {
    time: Big,
    depth: Big,
    velocity: Big,
}

/// A flight at one precision.
struct Raw {
    outcome: Outcome,
    stage: usize,
    end: Point,
    events: Vec<(EventKind, Point)>,
    margin: Option<Big>,
    impact_speed: Big,
}

impl Raw {
    fn same_course(&self, other: &Self) -> bool {
        self.outcome == other.outcome
            && self.stage == other.stage
            && self.events.iter().map(|e| e.0).eq(other.events.iter().map(|e| e.0))
    }

    fn agrees(&self, other: &Self) -> bool {
        let points = |a: &Point, b: &Point| {
            agree(&a.time, &b.time) && agree(&a.depth, &b.depth) && agree(&a.velocity, &b.velocity)
        };
        self.same_course(other)
            && points(&self.end, &other.end)
            && self.events.iter().zip(&other.events).all(|(a, b)| points(&a.1, &b.1))
            && match (&self.margin, &other.margin) {
                // A margin that is all cancellation is good to 50 digits of one.
                (Some(a), Some(b)) => agree(a, b) || (magnitude(a - b) << AGREEMENT_BITS) < Big::ONE,
                (None, None) => true,
                _ => false,
            }
    }

    fn crater_end(&self) -> Option<&Point> {
        self.events.iter().find(|e| e.0 == EventKind::CraterEnd).map(|e| &e.1)
    }

    fn into_exact(self) -> ExactFlight {
        let state = |p: Point| ExactState { time: Exact(p.time), depth: Exact(p.depth), velocity: Exact(p.velocity) };
        ExactFlight {
            outcome: self.outcome,
            stage: self.stage,
            end: state(self.end),
            events: self.events.into_iter().map(|(kind, p)| ExactEvent { kind, state: state(p) }).collect(),
            exit_margin: self.margin.map(Exact),
            impact_speed: Exact(self.impact_speed),
        }
    }
}

impl Model {
    /// Where stage `index` is left: its end or the exit; none when there is neither.
    fn limit(&self, index: usize) -> Option<&Big> {
        match (&self.stages[index].end, &self.exit) {
            (Some(end), Some(exit)) => Some(if exit < end { exit } else { end }),
            (end, exit) => end.as_ref().or(exit.as_ref()),
        }
    }

    fn boundary(&self, index: usize) -> EventKind {
        if self.crater == Some(index) { EventKind::CraterEnd } else { EventKind::StageEnd(index) }
    }

    fn stop_in(&self, index: usize) -> Outcome {
        match (self.target, self.crater) {
            (Target::Stages, _) => Outcome::Stopped,
            (Target::CraterAndTunnel, Some(crater)) if index <= crater => Outcome::StoppedInCrater,
            (Target::CraterAndTunnel, _) => Outcome::StoppedInTunnel,
        }
    }
}

/// Flies the model.
fn fly(model: &Model) -> Result<Raw, ReferenceError> {
    let zero = int(0, model.bits);
    let mut now = Point { time: zero.clone(), depth: zero.clone(), velocity: model.impact_speed.clone() };
    let mut events: Vec<(EventKind, Point)> = Vec::new();
    let mut flown = None;
    let finish = |outcome, stage, end: Point, events: Vec<(EventKind, Point)>| {
        let margin = margin(model, outcome, stage, &end, &events);
        Raw { outcome, stage, end, events, margin, impact_speed: model.impact_speed.clone() }
    };
    for (index, law) in model.stages.iter().enumerate() {
        let limit = model.limit(index);
        if limit.is_none_or(|limit| *limit > now.depth) {
            let rests = if is_zero(&now.velocity) {
                true
            } else {
                let (next, rests) = through(model, index, law, &now, limit)?;
                now = next;
                flown = Some(index);
                rests
            };
            if rests {
                events.push((EventKind::Rest, now.clone()));
                let stage = flown.unwrap_or(index);
                return Ok(finish(model.stop_in(stage), stage, now, events));
            }
        }
        if law.end.is_some() && law.end.as_ref() == limit {
            // Even at the exit: that is left to the last stage there, of no length, so that every end is told before.
            events.push((model.boundary(index), now.clone()));
        } else if limit.is_some() {
            events.push((EventKind::Exit, now.clone()));
            if is_zero(&now.velocity) {
                events.push((EventKind::Rest, now.clone()));
            }
            return Ok(finish(Outcome::Perforated, flown.unwrap_or(index), now, events));
        }
    }
    Err(ReferenceError::NeverEnds)
}

/// One stage: the point at its limit and `false`, or the point of rest and `true`.
fn through(
    model: &Model,
    index: usize,
    law: &Law,
    from: &Point,
    limit: Option<&Big>,
) -> Result<(Point, bool), ReferenceError> {
    if is_positive(&law.r) {
        if is_positive(&law.q) {
            return Err(ReferenceError::Unsupported { stage: index, why: "viscosity and drag act together" });
        }
        return damped(model, law, from, limit);
    }
    // Without viscosity W over x decides. In a resisting or driven stage alike W >= 0 at the limit means W > 0 before.
    let bits = model.bits;
    if let Some(limit) = limit {
        let (gain, loss) = squared_speed_terms(law, &model.mass, &square(&from.velocity), &from.depth, limit, bits);
        let w = &gain - &loss;
        let touches = vanishes(&w, &(magnitude(gain) + magnitude(loss)), bits);
        if touches || is_positive(&w) {
            let velocity = if touches { int(0, bits) } else { w.sqrt() };
            let time = &from.time + passage_time(model, law, from, limit, &velocity);
            return Ok((Point { time, depth: limit.clone(), velocity }, false));
        }
    }
    let depth = rest_depth(model, law, from)?;
    let velocity = int(0, bits);
    let time = &from.time + passage_time(model, law, from, &depth, &velocity);
    Ok((Point { time, depth, velocity }, true))
}

/// W at `to` as gain minus loss, `w` at `from` carried through a stage without viscosity.
fn squared_speed_terms(law: &Law, mass: &Big, w: &Big, from: &Big, to: &Big, bits: usize) -> (Big, Big) {
    let Law { p, s, q, .. } = law;
    if is_zero(q) {
        let work = p * (to - from) + half(s * (square(to) - square(from)));
        return (w.clone(), twice(work) / mass);
    }
    // W_p = s M/(2 q²) - (p + s x)/q solves W' = -2 (p + s x + q W)/M.
    let particular = |x: &Big| half(s * mass) / square(q) - (p + s * x) / q;
    let decay = (-(twice(q * (to - from)) / mass)).with_precision(bits).value().exp();
    (w * &decay, particular(from) * decay - particular(to))
}

/// Depth of rest in a stage without viscosity and without a limit.
fn rest_depth(model: &Model, law: &Law, from: &Point) -> Result<Big, ReferenceError> {
    let Law { p, s, q, .. } = law;
    let (mass, w0, bits) = (&model.mass, square(&from.velocity), model.bits);
    match (is_positive(s), is_positive(q)) {
        (false, _) if !is_positive(p) => Err(ReferenceError::NeverEnds),
        (false, false) => Ok(&from.depth + mass * w0 / twice(p.clone())),
        (false, true) => Ok(&from.depth + mass / twice(q.clone()) * ln(&(int(1, bits) + q * w0 / p))),
        (true, false) => {
            let u0 = &from.depth + p / s;
            Ok((square(&u0) + w0 * mass / s).sqrt() - p / s)
        }
        (true, true) => {
            let w = |x: &Big| {
                let (gain, loss) = squared_speed_terms(law, mass, &w0, &from.depth, x, bits);
                gain - loss
            };
            // Without the drag it would get further: the bracket.
            let u0 = &from.depth + p / s;
            let far = (square(&u0) + &w0 * mass / s).sqrt() - p / s;
            let slope = |x: &Big, w: &Big| -(twice(p + s * x + q * w) / mass);
            Ok(root(&from.depth, &far, bits, |x| {
                let value = w(x);
                let slope = slope(x, &value);
                // Falling through zero: turned over to rise.
                (-value, -slope)
            }))
        }
    }
}

/// Time from `from` to depth `to`, where the speed is `velocity`, in a stage without viscosity.
fn passage_time(model: &Model, law: &Law, from: &Point, to: &Big, velocity: &Big) -> Big {
    let Law { p, s, q, .. } = law;
    let (mass, bits, v0) = (&model.mass, model.bits, &from.velocity);
    let xi = to - &from.depth;
    if is_zero(&xi) {
        return int(0, bits);
    }
    match (is_positive(s), is_positive(q)) {
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
    }
}

/// `∫ dx/V` by the tanh-sinh rule, whose double exponential swallows the root of W at rest.
///
/// With `x = a + (b - a) z`, `z = 1/(1 + e^{-2 sigma})`, `sigma = (pi/2) sinh(h j)`. W near its zero is a difference,
/// which costs the time of rest half of its bits: the attempts with more of them make up for it.
fn quadrature(model: &Model, law: &Law, from: &Point, to: &Big) -> Big {
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
    for j in -(steps * 11 / 2)..=(steps * 11 / 2) {
        let at = int(j, bits) * &h;
        let grow = at.exp();
        let shrink = &one / &grow;
        let sigma = &half_pi * half(&grow - &shrink);
        let far = twice(sigma).exp();
        let near_end = &one / (&one + &far);
        let z = &far / (&one + &far);
        let x = &from.depth + &length * &z;
        let (gain, loss) = squared_speed_terms(law, &model.mass, &squared, &from.depth, &x, bits);
        let w = gain - loss;
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
    fn new(law: &Law, mass: &Big, from: &Point, bits: usize) -> Self {
        let Law { p, s, r, .. } = law;
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
fn damped(model: &Model, law: &Law, from: &Point, limit: Option<&Big>) -> Result<(Point, bool), ReferenceError> {
    let bits = model.bits;
    let motion = Linear::new(law, &model.mass, from, bits);
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
fn margin(model: &Model, outcome: Outcome, stage: usize, end: &Point, events: &[(EventKind, Point)]) -> Option<Big> {
    let exit = model.exit.as_ref()?;
    if is_zero(&model.impact_speed) {
        return None;
    }
    let scale = square(&model.impact_speed);
    let mut least: Option<Big> = None;
    let mut take = |w: Big| {
        if least.as_ref().is_none_or(|least| w < *least) {
            least = Some(w);
        }
    };
    if outcome == Outcome::Perforated {
        for (kind, point) in events {
            if *kind != EventKind::Rest {
                take(square(&point.velocity));
            }
        }
    } else {
        let (mut w, mut from) = (int(0, model.bits), end.depth.clone());
        for index in stage..model.stages.len() {
            let law = &model.stages[index];
            let to = model.limit(index)?.clone();
            if is_positive(&law.r) {
                let work = &law.p * (&to - &from) + half(&law.s * (square(&to) - square(&from)));
                w -= twice(work) / &model.mass;
            } else {
                let (gain, loss) = squared_speed_terms(law, &model.mass, &w, &from, &to, model.bits);
                w = gain - loss;
            }
            take(w.clone());
            from = to;
            if law.end.as_ref().is_none_or(|end| end >= exit) {
                break;
            }
        }
    }
    least.map(|w| w / scale)
}

/// Mass and `V_c²`: W at each stage end up to the exit is affine in V0², and none may be below zero.
fn squared_critical(source: Source<'_>, inputs: &[Big], bits: usize) -> Result<(Big, Big), ReferenceError> {
    // The models at V0² = 0 and 1 (input 1 is the impact speed in either source): only a continuous crater differs.
    let at = |impact_speed: i32| {
        let mut inputs = inputs.to_vec();
        inputs[1] = int(impact_speed, bits);
        source.model(&inputs, bits)
    };
    let (model, moved) = (at(0)?, at(1)?);
    let exit = model.exit.as_ref().ok_or(ReferenceError::NoCritical)?;
    // W = w + slope V0² at depth `from`.
    let (mut w, mut slope, mut from) = (int(0, bits), int(1, bits), int(0, bits));
    let mut squared = int(0, bits);
    for (index, (law, moved_law)) in model.stages.iter().zip(&moved.stages).enumerate() {
        let to = model.limit(index).ok_or(ReferenceError::NoCritical)?;
        if *to > from {
            if is_positive(&law.r) {
                return Err(ReferenceError::NoCritical);
            }
            let carried = |law: &Law, w: &Big| {
                let (gain, loss) = squared_speed_terms(law, &model.mass, w, &from, to, bits);
                gain - loss
            };
            // Only the continuous crater needs the difference, in which a slope of e^{-y} would drown.
            slope = if law.s == moved_law.s {
                slope * (-(twice(&law.q * (to - &from)) / &model.mass)).exp()
            } else {
                carried(moved_law, &(&w + slope)) - carried(law, &w)
            };
            w = carried(law, &w);
            from.clone_from(to);
            let demand = -(&w / &slope);
            if demand > squared {
                squared = demand;
            }
        }
        if law.end.as_ref().is_none_or(|end| end >= exit) {
            break;
        }
    }
    Ok((model.mass, squared))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]
    use super::*;
    use crate::physics::scene::Concrete;
    use crate::physics::stage::Stage;

    fn problem(stages: &[Stage], impact_speed: f64, exit_depth: f64) -> Problem {
        Problem {
            mass: 2.0,
            impact_speed,
            exit_depth,
            stages: stages.iter().copied().collect(),
            crater: None,
            target: Target::Stages,
        }
    }

    /// Relative difference of two big floats.
    fn apart(a: &Big, b: &Big) -> f64 {
        (magnitude(a - b) / magnitude(b.clone())).to_f64().value()
    }

    #[test]
    fn elementary_functions_agree_with_the_library_and_with_identities() {
        for (numerator, denominator) in [(7, 9), (1, 1_000_003), (123_456, 7), (1, 1)] {
            let z = int(numerator, 256) / int(denominator, 256);
            assert!(apart(&atan(&z), &z.atan()) < 1e-70);
            let y = &z + int(1, 256);
            // Near one the roots cost sixteen bits and the argument its own twenty.
            assert!(apart(&ln(&y), &y.ln()) < 1e-64);
            assert!(apart(&ln(&y).exp(), &y) < 1e-64);
            for (sy, sx) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let (y, x) = (&z * int(sy, 256), int(sx, 256));
                assert!(apart(&atan2(&y, &x, 256), &y.atan2(&x)) < 1e-70, "{sy} {sx}");
            }
        }
        assert_eq!(atan2(&Big::ZERO, &int(-1, 256), 256), Big::pi(256));
        // Machin: pi/4 = 4 atan(1/5) - atan(1/239).
        let fraction = |n| int(1, 256) / int(n, 256);
        let machin = (atan(&fraction(5)) << 4) - (atan(&fraction(239)) << 2);
        assert!(apart(&machin, &Big::pi(256)) < 1e-75);
    }

    /// Whether the first 48 digits are those of `digits`.
    fn assert_digits(exact: &Exact, digits: &str) {
        let shown = exact.to_decimal(50);
        let significant = |text: &str| text.trim_start_matches(['0', '.']).replace('.', "")[..48].to_owned();
        assert_eq!(significant(&shown), significant(digits), "{shown} is not {digits}");
    }

    #[test]
    fn flights_have_the_50_digits_of_a_taylor_integration_of_the_equation_of_motion() {
        // mpmath 1.3.0, odefun at 70 digits (Taylor series of the equation, no closed form), events by findroot:
        // M = 2 kg; p, s, r, q; V0; [T, X] at rest when it rests, then [t, V] at x = 0.25 m.
        type Case = ([f64; 4], f64, Option<[&'static str; 2]>, [&'static str; 2]);
        let cases: [Case; 5] = [
            (
                [100.0, 50.0, 3.0, 0.0],
                10.0,
                Some([
                    "0.1436480398033285128838091009679671181352217854781109",
                    "0.7233580939141266333161533939084721917419804764546068",
                ]),
                [
                    "0.02750764993387161230309206021786409981502998861871275",
                    "8.160755698439112898951263331175209520921880397124731",
                ],
            ),
            (
                [100.0, 50.0, 40.0, 0.0],
                10.0,
                Some([
                    "0.07603459963009463475310942548804058242016277309471764",
                    "0.2902956610774561305897428290522743332925740961351568",
                ]),
                [
                    "0.04264223885741157320422351534768555790848867931006064",
                    "2.707299651822331005253424106540591501813351410542086",
                ],
            ),
            (
                [100.0, 0.0, 3.0, 0.0],
                10.0,
                Some([
                    "0.1749095096449940346903306579206362648027776374209561",
                    "0.8363496785001988436556447359787911732407454193014635",
                ]),
                [
                    "0.02740833822672784376776165178901438148613186069882230",
                    "8.254583088663607811611917410549280925693406965058885",
                ],
            ),
            (
                [-40.0, 0.0, 0.0, 0.5],
                20.0,
                None,
                [
                    "0.01281501993864269016063512313366177804939093243492487",
                    "19.03678042178011068621646400694561841280086951319930",
                ],
            ),
            (
                [100.0, 50.0, 0.0, 0.5],
                10.0,
                Some([
                    "0.1431232539250746214127512051254289622924251649251116",
                    "0.7034674224983916520498186018599021303429284310342236",
                ]),
                [
                    "0.02787169522926311383514831318165740035152529546328560",
                    "7.952967386985787224345939111538901684438951382815890",
                ],
            ),
        ];
        for ([p, s, r, q], impact_speed, rest, passing) in cases {
            let stage = Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end: f64::INFINITY };
            if let Some([time, depth]) = rest {
                let rested = flight(Source::Problem(&problem(&[stage], impact_speed, f64::INFINITY))).unwrap();
                assert_eq!(rested.outcome, Outcome::Stopped);
                assert_digits(&rested.end.time, time);
                assert_digits(&rested.end.depth, depth);
            }
            let left = flight(Source::Problem(&problem(&[stage], impact_speed, 0.25))).unwrap();
            assert_eq!(left.outcome, Outcome::Perforated);
            assert_digits(&left.end.time, passing[0]);
            assert_digits(&left.end.velocity, passing[1]);
        }
    }

    #[test]
    fn quadrature_of_the_time_gives_the_closed_tunnel_time_to_rest_and_short_of_it() {
        let tunnel = Stage::tunnel(1e5, 3.0);
        let source = problem(&[tunnel], 300.0, 0.2);
        // To rest half of the digits are lost, where W is a small difference.
        for (exit_depth, limit) in [(0.2, 1e-113), (f64::INFINITY, 1e-55)] {
            let source = Problem { exit_depth, ..source.clone() };
            let exact = flight(Source::Problem(&source)).unwrap();
            let model = Source::Problem(&source).model(&Source::Problem(&source).inputs(384), 384).unwrap();
            let start = Point { time: int(0, 384), depth: int(0, 384), velocity: model.impact_speed.clone() };
            let summed = quadrature(&model, &model.stages[0], &start, &exact.end.depth.0);
            let off = apart(&summed, &exact.end.time.0);
            assert!(off < limit, "{off:e}");
        }
    }

    #[test]
    fn condition_numbers_of_a_constant_force_are_its_exponents() {
        // X = M V0²/(2 p), T = M V0/p.
        let by = conditions(Source::Problem(&problem(&[Stage::tunnel(1e5, 0.0)], 300.0, f64::INFINITY))).unwrap();
        assert!((by.depth - 4.0).abs() < 4.0 * f64::EPSILON, "{by:?}");
        assert!((by.time - 3.0).abs() < 3.0 * f64::EPSILON, "{by:?}");
        assert_eq!(by.velocity, 0.0);
        // V_c = sqrt(2 p H/M): three inputs of one half.
        let by = critical_condition(Source::Problem(&problem(&[Stage::tunnel(1e5, 0.0)], 300.0, 1.0))).unwrap();
        assert!((by - 1.5).abs() < 2.0 * f64::EPSILON, "{by}");
    }

    #[test]
    fn a_tie_is_reached_with_no_speed_left() {
        // w = 10 and V0 = 10: X = 1 in either sense.
        let tie = |exit_depth| Problem {
            mass: 1.0,
            crater: Some(0),
            target: Target::CraterAndTunnel,
            ..problem(&[Stage::crater(100.0, 1.0), Stage::tunnel(100.0, 1.0)], 10.0, exit_depth)
        };
        let stopped = flight(Source::Problem(&tie(2.0))).unwrap();
        assert_eq!(stopped.outcome, Outcome::StoppedInCrater);
        let kinds: Vec<_> = stopped.events.iter().map(|e| e.kind).collect();
        assert_eq!(kinds, [EventKind::CraterEnd, EventKind::Rest]);
        let through = flight(Source::Problem(&tie(1.0))).unwrap();
        assert_eq!((through.outcome, through.end.velocity.to_f64()), (Outcome::Perforated, 0.0));
        let kinds: Vec<_> = through.events.iter().map(|e| e.kind).collect();
        assert_eq!(kinds, [EventKind::CraterEnd, EventKind::Exit, EventKind::Rest]);
    }

    #[test]
    fn errors_of_a_64_bit_number_are_measured_below_its_rounding() {
        let third = Exact(int(1, 256) / int(3, 256));
        // 1/3 rounds down by a third of 2^-54, a relative 2^-54.
        assert_eq!(third.relative_error(1.0 / 3.0), 2.0_f64.powi(-54));
        assert_eq!(third.relative_error(f64::NAN), f64::INFINITY);
        assert_eq!(Exact(Big::ZERO).relative_error(0.0), 0.0);
        assert_eq!(Exact(Big::ZERO).relative_error(1e-300), f64::INFINITY);
        assert_eq!(third.to_decimal(50), format!("0.{}", "3".repeat(50)));
    }

    #[test]
    fn what_has_no_answer_is_an_error() {
        let free = Stage { static_force: 0.0, ..Stage::tunnel(0.0, 0.0) };
        let endless = problem(&[free], 10.0, f64::INFINITY);
        assert_eq!(flight(Source::Problem(&endless)), Err(ReferenceError::NeverEnds));
        assert_eq!(critical(Source::Problem(&endless)), Err(ReferenceError::NoCritical));
        let both = Stage { viscosity: 1.0, ..Stage::tunnel(1.0, 1.0) };
        let error = flight(Source::Problem(&problem(&[both], 10.0, 1.0))).unwrap_err();
        assert_eq!(error.to_string(), "no reference for stage 0: viscosity and drag act together");
    }

    /// Forrestal 1994 shot 14, as published: S = 12, k = 2.
    fn shot_14(thickness: Option<f64>, criterion: Criterion) -> Scene {
        Scene {
            title: None,
            mass: 0.906,
            resistance: Resistance::Concrete(Concrete {
                diameter: 0.0269,
                nose_factor: 0.15625,
                strength: 35.2e6,
                density: 2370.0,
                static_factor: 12.0,
                inertia_factor: 1.0,
                crater_ratio: 2.0,
                crater_stiffness: CraterStiffness::Continuous,
                layers: Vec::new(),
            }),
            thickness,
            criterion,
            velocity: None,
        }
    }

    #[test]
    fn a_scene_has_the_50_digits_of_the_formulas_in_another_program() {
        // mpmath 1.3.0 at 70 digits, theory section 2 in its plain forms.
        let scene = shot_14(None, Criterion::FullDepth);
        let exact = flight(Source::Scene(&scene, 277.0)).unwrap();
        assert_digits(&exact.end.depth, "0.1671950802699606820281951756134182369920137166438979");
        assert_digits(&exact.end.time, "0.001122301305544897903917260544220359543407377520436004");
        assert_digits(&exact.crater_end().unwrap().velocity, "248.4003030578009719391434245885765193341631673876338");
        let scene = shot_14(Some(0.1), Criterion::FullDepth);
        let exact = critical(Source::Scene(&scene, 0.0)).unwrap();
        assert_digits(&exact.velocity, "198.2723996547944194740407906105459115520752497552203");
    }

    #[test]
    fn at_the_critical_velocity_the_margin_is_zero_to_its_rounding_and_just_beyond_the_outcome_changes() {
        let scene = shot_14(Some(0.1), Criterion::FullDepth);
        let critical = critical(Source::Scene(&scene, 0.0)).unwrap().velocity.to_f64();
        let at = |speed| flight(Source::Scene(&scene, speed)).unwrap();
        let margin = at(critical).exit_margin.unwrap();
        assert!(margin.error_over(0.0, &Exact::one()) < 2.0 * f64::EPSILON);
        assert_eq!(at(critical.next_up()).outcome, Outcome::Perforated);
        assert_eq!(at(critical.next_down()).outcome, Outcome::StoppedInTunnel);
    }

    #[test]
    fn the_ndrc_exit_depth_inverts_the_relation_on_both_branches() {
        let d = int(1, 256);
        // y = 2 gives e = 1.32 + 2.48 = 3.80; y = 1 gives e = 3.19 - 0.718 = 2.472.
        let ratio = |numerator, denominator| int(numerator, 256) / int(denominator, 256);
        assert!(apart(&ndrc_depth(&ratio(380, 100), &d, 256), &int(2, 256)) < 1e-75);
        assert!(apart(&ndrc_depth(&ratio(2472, 1000), &d, 256), &int(1, 256)) < 1e-75);
        // The first ends at e = 2.997945; just beyond, e = 3 and 3.2 give (e - 1.32)/1.24.
        for hundredths in [300, 320] {
            let y = ratio(hundredths - 132, 124);
            assert!(apart(&ndrc_depth(&ratio(hundredths, 100), &d, 256), &y) < 1e-75);
        }
        // Of two depths for e = 2.996 the smaller: 1.3498, not 1.3516.
        let shallow = ndrc_depth(&ratio(2996, 1000), &d, 256).to_f64().value();
        assert!(shallow > 1.348 && shallow < 1.35, "{shallow}");
        let scene = shot_14(Some(3.8 * 0.0269), Criterion::Ndrc);
        let exact = flight(Source::Scene(&scene, 500.0)).unwrap();
        assert!((exact.end.depth.to_f64() / 0.0538 - 1.0).abs() < 4.0 * f64::EPSILON);
    }

    fn stage(p: f64, s: f64, r: f64, q: f64, end: f64) -> Stage {
        Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end }
    }

    fn kinds(flight: &ExactFlight) -> Vec<EventKind> {
        flight.events.iter().map(|event| event.kind).collect()
    }

    /// Depth and velocity a time `t` after `from` under `law`: the power series of the equation of motion, sixty terms
    /// in each of 64 legs. It knows no solution.
    fn carried(law: &Stage, mass: f64, from: &ExactState, t: &Big) -> (Big, Big) {
        let [p, s, r, q, mass] =
            [law.static_force, law.stiffness, law.viscosity, law.drag, mass].map(|value| big(value, 256));
        let leg = t.clone().with_precision(256).value() / int(64, 256);
        let (mut depth, mut velocity) = (from.depth.0.clone(), from.velocity.0.clone());
        for _ in 0..64 {
            let (mut x, mut v) = (vec![depth], vec![velocity]);
            for n in 0..60 {
                let mut force = &s * &x[n] + &r * &v[n];
                if n == 0 {
                    force += &p;
                }
                if !is_zero(&q) {
                    force += &q * (0..=n).fold(Big::ZERO, |sum, k| sum + &v[k] * &v[n - k]);
                }
                let next = int(i32::try_from(n + 1).unwrap(), 256);
                x.push(&v[n] * &leg / &next);
                v.push(-(force * &leg / (&mass * &next)));
            }
            let sum = |terms: &[Big]| terms.iter().rev().fold(int(0, 256), |sum, term| sum + term);
            (depth, velocity) = (sum(&x), sum(&v));
        }
        (depth, velocity)
    }

    /// The flight of `problem`, seen to solve the equation of motion from each event to the next, to 48 digits.
    fn flown(problem: &Problem) -> ExactFlight {
        let flight = flight(Source::Problem(problem)).unwrap();
        let zero = Exact(int(0, 256));
        let mut from = ExactState { time: zero.clone(), depth: zero, velocity: flight.impact_speed.clone() };
        for ExactEvent { kind, state: to } in &flight.events {
            let place = match kind {
                EventKind::Exit => Some(problem.exit_depth),
                EventKind::StageEnd(index) => Some(problem.stages[*index].end),
                _ => None,
            };
            assert_eq!(place.map_or(0.0, |place| to.depth.relative_error(place)), 0.0, "{kind:?}");
            let middle = half(&from.depth.0 + &to.depth.0).to_f64().value();
            let law = problem.stages.iter().find(|law| law.end > middle).unwrap();
            let (depth, velocity) = carried(law, problem.mass, &from, &(&to.time.0 - &from.time.0));
            let off = [(depth, &to.depth, &flight.end.depth), (velocity, &to.velocity, &flight.impact_speed)]
                .map(|(found, told, scale)| (magnitude(found - &told.0) / &scale.0).to_f64().value());
            assert!(off[0] < 1e-48 && off[1] < 1e-48, "{kind:?}: {off:?}");
            from = to.clone();
        }
        assert_eq!(flight.end, from);
        flight
    }

    #[test]
    fn flights_solve_the_equation_of_motion_from_event_to_event() {
        let none = f64::INFINITY;
        let cases: [(&[Stage], f64, f64, Outcome); 6] = [
            // Spring and drag together, from a depth of their own.
            (&[stage(0.0, 0.0, 0.0, 0.0, 1.0), stage(2.0, 2.0, 0.0, 0.25, none)], 1.0, none, Outcome::Stopped),
            // Critically damped: at rest, and on the way to it.
            (&[stage(100.0, 8.0, 8.0, 0.0, none)], 10.0, none, Outcome::Stopped),
            (&[stage(100.0, 8.0, 8.0, 0.0, none)], 10.0, 0.25, Outcome::Perforated),
            // All kinds in a row, each from where the one before leaves off.
            (
                &[
                    stage(10.0, 0.0, 0.0, 0.5, 0.125),
                    stage(0.0, 50.0, 0.0, 0.0, 0.25),
                    stage(-40.0, 0.0, 0.0, 0.5, 0.375),
                    stage(20.0, 0.0, 3.0, 0.0, 0.5),
                    stage(100.0, 8.0, 8.0, 0.0, 0.625),
                    stage(100.0, 50.0, 3.0, 0.0, none),
                ],
                10.0,
                none,
                Outcome::Stopped,
            ),
            (
                &[
                    stage(0.0, 0.0, 0.0, 0.5, 0.125),
                    stage(5.0, 0.0, 0.0, 0.0, 0.25),
                    stage(100.0, 50.0, 40.0, 0.0, none),
                ],
                10.0,
                0.375,
                Outcome::Perforated,
            ),
            (&[stage(0.0, 0.0, 3.0, 0.0, 0.125), stage(3.0, 0.0, 2.0, 0.0, none)], 1.0, none, Outcome::Stopped),
        ];
        for (list, impact_speed, exit_depth, outcome) in cases {
            let flight = flown(&problem(list, impact_speed, exit_depth));
            assert_eq!((flight.outcome, flight.stage), (outcome, list.len() - 1));
        }
    }

    #[test]
    fn rest_under_spring_and_drag_is_the_zero_of_the_series_of_w() {
        // dW/dx = -2 (p + s x + q W)/M as a power series about the start, which converges everywhere. Light and heavy,
        // weak and stiff, with the drag without account or nearly alone.
        let none = f64::INFINITY;
        for (mass, speed, start, law) in [
            (2.0, 1.0, 1.0, stage(2.0, 2.0, 0.0, 0.25, none)),
            (2.0, 1.0, 0.0, stage(1.0, 0.25, 0.0, 0.5, none)),
            (2.0, 4.0, 0.0, stage(0.5, 0.25, 0.0, 0.01, none)),
            (2.0, 0.7, 0.0, stage(0.1, 1.0, 0.0, 0.1, none)),
            (2.0, 6.0, 0.0, stage(3.0, 4.0, 0.0, 0.01, none)),
            (1024.0, 1.0, 0.0, stage(1.0, 1.0, 0.0, 1.0, none)),
            (2.0, 1.0, 0.0, stage(1.0, 1_048_576.0, 0.0, 1.0, none)),
            (2.0, 0.0625, 0.0, stage(1.0, 1.0, 0.0, 1024.0, none)),
        ] {
            let source = Problem { mass, ..problem(&[law], speed, none) };
            let model = Source::Problem(&source).model(&Source::Problem(&source).inputs(256), 256).unwrap();
            let from = Point { time: int(0, 256), depth: big(start, 256), velocity: big(speed, 256) };
            let depth = rest_depth(&model, &model.stages[0], &from).unwrap();
            let xi = &depth - &from.depth;
            let Law { p, s, q, .. } = &model.stages[0];
            let mut term = square(&from.velocity);
            let mut w = term.clone();
            for n in 0..150 {
                let force = match n {
                    0 => p + s * &from.depth + q * &term,
                    1 => s * &xi + q * &term,
                    _ => q * &term,
                };
                term = -(twice(force * &xi) / (&model.mass * int(n + 1, 256)));
                w += &term;
            }
            let left = (magnitude(w) / square(&from.velocity)).to_f64().value();
            assert!(is_positive(&xi) && left < 1e-70, "{law:?}: {left:e}");
        }
    }

    #[test]
    fn a_linear_dashpot_is_crossed_in_a_logarithm_at_any_speed() {
        // M = r = 2: V = V0 - x and t = ln(V0/V), so half of V0 is left after x = V0/2 and t = ln 2.
        for exponent in [-60, 0, 200] {
            let impact_speed = 2.0_f64.powi(exponent);
            let exact = flight(Source::Problem(&problem(
                &[stage(0.0, 0.0, 2.0, 0.0, f64::INFINITY)],
                impact_speed,
                0.5 * impact_speed,
            )))
            .unwrap();
            assert!(apart(&exact.end.time.0, &int(2, 384).ln()) < 1e-50);
            assert!(exact.end.velocity.relative_error(0.5 * impact_speed) < 1e-50);
        }
    }

    #[test]
    fn stage_ends_at_one_place_are_each_told_with_or_without_speed_and_before_the_exit() {
        let law = |end| stage(64.0, 0.0, 0.0, 0.0, end);
        let none = f64::INFINITY;
        let [first, second] = [EventKind::StageEnd(0), EventKind::StageEnd(1)];
        // M = 2, V0 = 8: rest at x = 1.
        let rest = flight(Source::Problem(&problem(&[law(1.0), law(1.0), law(none)], 8.0, none))).unwrap();
        assert_eq!((kinds(&rest), rest.stage), (vec![first, second, EventKind::Rest], 0));
        for (list, exit_depth, events, stage) in [
            (vec![law(1.0), law(1.0), law(none)], 1.0, vec![first, second, EventKind::Exit, EventKind::Rest], 0),
            (vec![law(0.5), law(0.5), law(none)], 0.5, vec![first, second, EventKind::Exit], 0),
            (vec![law(0.5), law(0.75), law(none)], 0.5, vec![first, EventKind::Exit], 0),
            (vec![law(0.5), law(0.5), law(none)], 0.75, vec![first, second, EventKind::Exit], 2),
            (vec![law(0.5), law(none)], 0.25, vec![EventKind::Exit], 0),
            (vec![law(0.0), law(0.0), law(none)], 0.0, vec![first, second, EventKind::Exit], 2),
            (vec![law(0.0), law(0.5), law(none)], 0.0, vec![first, EventKind::Exit], 1),
            (vec![law(0.5), law(none)], 0.0, vec![EventKind::Exit], 0),
        ] {
            let exact = flight(Source::Problem(&problem(&list, 8.0, exit_depth))).unwrap();
            assert_eq!((exact.outcome, kinds(&exact), exact.stage), (Outcome::Perforated, events, stage), "{list:?}");
        }
    }

    #[test]
    fn a_tie_is_seen_through_rounding_and_its_condition_is_infinite() {
        let none = f64::INFINITY;
        let [inner, exit, rest] = [EventKind::StageEnd(0), EventKind::Exit, EventKind::Rest];
        // W falls from 1 to 1 - 1/M at x = 1/2, which no binary number is, and to 0 at x = 1.
        for mass in [3.0, 5.0, 7.0, 11.0, 13.0] {
            let list = [stage(1.0, 0.0, 0.0, 0.0, 0.5), stage(mass - 1.0, 0.0, 0.0, 0.0, none)];
            let tie = Problem { mass, ..problem(&list, 1.0, 1.0) };
            let exact = flight(Source::Problem(&tie)).unwrap();
            assert_eq!((exact.outcome, kinds(&exact)), (Outcome::Perforated, vec![inner, exit, rest]), "{mass}");
            assert_eq!(exact.end.velocity.to_f64(), 0.0);
            assert_eq!(conditions(Source::Problem(&tie)).unwrap().depth, f64::INFINITY);
        }
        // M x'' = -(2 + 2 x + 3 x'), M = 1, V0 = 3: u = x + 1 = 5 e^-t - 4 e^-2t, whose largest value is 25/16 at e^-t = 5/8.
        let damped = Problem { mass: 1.0, ..problem(&[stage(2.0, 2.0, 3.0, 0.0, none)], 3.0, 9.0 / 16.0) };
        let exact = flight(Source::Problem(&damped)).unwrap();
        assert_eq!((exact.outcome, kinds(&exact)), (Outcome::Perforated, vec![exit, rest]));
        assert_eq!(exact.end.velocity.to_f64(), 0.0);
        assert!(apart(&exact.end.time.0, &(int(8, 384) / int(5, 384)).ln()) < 1e-50);
        // What is left of W is small beside W0 only: 2^350 of 2^400.
        let fast = 2.0_f64.powi(200);
        let force = fast * fast * (1.0 - 2.0_f64.powi(-50));
        let exact = flight(Source::Problem(&problem(&[stage(force, 0.0, 0.0, 0.0, none)], fast, 1.0))).unwrap();
        assert_eq!(exact.end.velocity.to_f64(), 2.0_f64.powi(175));
    }

    #[test]
    fn two_precisions_agree_when_course_and_every_number_do() {
        let at = |n| Point { time: int(n, 256), depth: int(n + 1, 256), velocity: int(n + 2, 256) };
        let raw = |edit: &dyn Fn(&mut Raw)| {
            let mut raw = Raw {
                outcome: Outcome::Stopped,
                stage: 1,
                end: at(4),
                events: vec![(EventKind::StageEnd(0), at(1)), (EventKind::Rest, at(4))],
                margin: Some(half(int(1, 256))),
                impact_speed: int(9, 256),
            };
            edit(&mut raw);
            raw
        };
        let base = raw(&|_| ());
        let other: [&dyn Fn(&mut Raw); 12] = [
            &|raw| raw.outcome = Outcome::Perforated,
            &|raw| raw.stage = 0,
            &|raw| raw.events[0].0 = EventKind::CraterEnd,
            &|raw| drop(raw.events.pop()),
            &|raw| raw.events[0].1.time += Big::ONE,
            &|raw| raw.events[0].1.depth += Big::ONE,
            &|raw| raw.events[1].1.velocity += Big::ONE,
            &|raw| raw.end.time += Big::ONE,
            &|raw| raw.end.depth += Big::ONE,
            &|raw| raw.end.velocity += Big::ONE,
            &|raw| raw.margin = Some(Big::ONE),
            &|raw| raw.margin = None,
        ];
        for (number, edit) in other.into_iter().enumerate() {
            assert!(!base.agrees(&raw(edit)) && !raw(edit).agrees(&base), "{number}");
        }
        let last_digits = |raw: &mut Raw| {
            for point in [&mut raw.end, &mut raw.events[0].1] {
                point.time += Big::ONE >> 174;
                point.depth += Big::ONE >> 174;
                point.velocity += Big::ONE >> 174;
            }
        };
        assert!(base.agrees(&raw(&last_digits)));
        let course: [&dyn Fn(&mut Raw); 3] = [other[0], other[1], other[2]];
        assert!(base.same_course(&raw(other[4])) && course.iter().all(|edit| !base.same_course(&raw(edit))));
        // A margin agrees in its own digits, or in 52 digits of one.
        let power = |exponent: isize| int(1, 256) >> exponent;
        let margins = |a: Option<Big>, b: Option<Big>| {
            raw(&|raw| raw.margin.clone_from(&a)).agrees(&raw(&|raw| raw.margin.clone_from(&b)))
        };
        assert!(margins(None, None));
        assert!(margins(Some(power(-100)), Some(power(-100) + power(80))));
        assert!(margins(Some(power(300)), Some(power(200))));
        assert!(margins(Some(power(175)), Some(-power(175))));
        assert!(!margins(Some(power(173)), Some(Big::ZERO)));
        assert!(!margins(Some(power(100)), Some(-power(100))));
        assert!(!margins(Some(power(100)), Some(power(99))));
    }

    #[test]
    fn agreement_is_52_digits_and_more_bits_are_tried_until_it_is_reached() {
        let one = int(1, 512);
        assert!(agree(&(&one + (one.clone() >> 174)), &one));
        assert!(!agree(&(&one + (one.clone() >> 173)), &one));
        assert!(!agree(&int(2, 256), &one) && !agree(&one, &int(2, 256)));
        assert!(agree(&Big::ZERO, &Big::ZERO) && !agree(&one, &Big::ZERO));
        // Half of the bits tell a difference from zero.
        assert!(vanishes(&(one.clone() >> 128), &one, 256) && !vanishes(&(one >> 127), &int(1, 256), 256));
        assert_eq!(settled(Ok, |_, _| true), Ok((384, 384)));
        assert_eq!(settled(Ok, |a, _| *a > 500), Ok((864, 864)));
        assert_eq!(settled(Ok, |_, _| false), Err(ReferenceError::Unsettled { bits: 6561 }));
    }

    #[test]
    fn one_input_at_a_time_is_moved_up_by_2_to_the_minus_80() {
        let source = problem(&[Stage::tunnel(1e5, 0.0)], 300.0, 1.0);
        let source = Source::Problem(&source);
        let inputs = source.inputs(256);
        let moved: Vec<Vec<Big>> = source.stepped_inputs(256).collect();
        // Mass, impact speed, exit depth and static force; the coefficients that are zero stay so.
        assert_eq!(moved.len(), 4);
        for (stepped, moving) in moved.iter().zip([0, 1, 2, 3]) {
            for (i, (after, before)) in stepped.iter().zip(&inputs).enumerate() {
                let step = if i == moving { before.clone() >> 80 } else { Big::ZERO };
                assert_eq!(after - before, step, "input {i}, step {moving}");
            }
        }
    }

    #[test]
    fn a_viscous_stage_of_no_depth_leaves_the_critical_velocity_as_it_is() {
        // V_c² = 2 p H/M = 9.
        let tunnel = Stage::tunnel(3.0, 0.0);
        let viscous = |end| stage(1.0, 0.0, 5.0, 0.0, end);
        for list in [vec![viscous(0.0), tunnel], vec![Stage { end: 1.0, ..tunnel }, viscous(1.0), tunnel]] {
            let critical = critical(Source::Problem(&problem(&list, 0.0, 3.0))).unwrap();
            assert_eq!((critical.velocity.to_f64(), critical.energy.to_f64()), (3.0, 9.0));
        }
        let thick = problem(&[viscous(1.0), tunnel], 0.0, 3.0);
        assert_eq!(critical(Source::Problem(&thick)), Err(ReferenceError::NoCritical));
    }
}
