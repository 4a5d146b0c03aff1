//! One stage whose force is an expression of its own: the series of V and x from the series of the expression.
//!
//! ```text
//! over time      x' = V,  V' = -F(x, V)/M                            s = t
//! over depth     (V²)' = -2 F(x, V)/M,  t' = 1/V                     s = x - x0
//! over velocity  t' = -M V'/F(x, V),  x' = V t'                      V = V0 (1-s)^m or V0 e^(-s), for F > 0
//! ```
//!
//! **Time or depth.** The method `taylor` goes over time, and `energy` over depth: the exit and the end of a stage are fixed ends of a
//! step then, and nothing grazes. Rest is a branch point of V over depth.
//!
//! **Velocity as variable.** A fractional power of V, as in `(V/v1)^1.5`, has a branch point at V = 0: the series in time
//! ends there, and steps shrink towards rest. With `V = u^m`, m the common denominator of the powers, F is smooth
//! in u, and rest is the fixed end u = 0 (docs/theory.md, section 10). Where V falls fast enough, steps go by u, else by
//! time. In place of depth it is taken for every law: m = 1 where no power has a branch point. Powers without a small common
//! denominator, and logarithms of V, are smooth in the logarithm of V, which never gets to rest.
//!
//! **Forces `p(x) + q(x) V²`.** `taylor` takes a step of them by integrals over depth ([`super::depth_integrals`]).
//!
//! **Forces of the velocity alone.** Both equations are integrals over V then, and `taylor` takes a step of them by the rule of
//! [`super::velocity_integrals`], where a few places show the force all along.
//!
//! **Length of a step.** The last two coefficients give it, as in [`super::taylor`]. They may vanish by chance, and a force may
//! change where they do not see it. So three places of the step are asked whether the series satisfies the equation there,
//! and a step on which it does not is shortened. Between them a narrow term may hide: a force that has no bound on a disc of the complex
//! plane around the step has one ([`Disc`]).
//!
//! **Branch points over depth.** `(x/l)^1.5` has no series at x = 0, nor has a root where its argument begins. A step so short
//! that F is `F0 + a (x - x0)^p` on it, to a rounding of what it takes of the energy, leaves such a place.
//!
//! **Kinks.** min, max and abs have one smooth branch on each side of a switch. A step takes one branch, and ends at the
//! first root of the switch.
//!
//! **Ends on a condition** g(x, V) = 0: the series of g comes with that of the force, and its first root on the step is
//! isolated like that of V, touching included. Where g comes so near to zero that the error bound leaves open whether it
//! vanishes, the flight is in doubt.
//!
//! **Events.** The first root of V on the step is isolated ([`locate::first_root`]). x grows until then, so that a boundary
//! is passed before it exactly when x reaches it there.

pub(super) mod side_by_side;

use std::cell::LazyCell;
use std::convert::Infallible;
use std::sync::Arc;

use smallvec::SmallVec;

use super::depth_integrals::{Ahead, Stretch, Way};
use super::flight::{Course, DRIVES, SLOW, StageEnd, StageSolver, VANISHES, VANISHING, rest_by_power};
use super::locate::{self, root_before, settled};
use super::outcome::{IntegrationError, Solved};
use super::taylor::{Precision, STEPS_MAX, power_of_two_below, rough_exp2, rough_log2};
use super::velocity_integrals::{Forces, Integrals, PLACES};
use crate::physics::condition::Sight;
use crate::physics::expression::{Around, Bound, Disc, Fall, Falling, Jets, product};
use crate::physics::scalar::reciprocal;
use crate::physics::{Condition, Law, Scalar, State};

/// Places of a step, over its length, at which the equation is asked, and the share of the step for which each stands: what the
/// equation lacks grows along it.
const ASKED: [f64; 3] = [1.0, 0.62, 0.29];
const STANDS_FOR: [f64; 3] = [0.19, 0.355, 0.455];

/// What the equation may lack over the step, in tolerances: truncation after order K has the factor K there.
const DEFECT_MAX: f64 = 100.0;

/// Times that a step may be shortened, each by [`SHORTENING`].
const SHORTENED_MAX: u32 = 100;
const SHORTENING: f64 = 0.7;

/// Distance to rest over the depth below which a force is about to end the flight, and no barrier holds it up.
const NEAR_REST: f64 = 1e-11;

/// Times that a step from a branch point is shortened, eightfold, and what it may take of the energy: the force changes by as
/// much with the velocity.
const BRANCH_TRIALS: i32 = 40;
const BRANCH_SHARE: f64 = 1e-9;

/// First parts of a step on which V may only fall: the series of a long step shows it nowhere near its end.
const FIRST_PARTS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// What the terms of a series may leave of g by cancelling, over g.
const CANCELLED: f64 = 1e-3;

/// Share of a root behind which a turn counts as beyond it: a double root is known to half of its digits.
const NEAR_TURN: f64 = 0.99999;

/// Part of the way to a root that its roundings may hide.
const FLAT: f64 = 1e-9;

/// How far behind a turn before zero a step goes on, over the way to it.
const BEHIND_TURN: f64 = 1e-3;

/// Longest step by velocity where the force vanishes at rest: its quotients cancel towards the end. So little of depth and time may
/// be left that it does not count.
const VANISHING_SPAN: f64 = 0.5;
const LITTLE: f64 = 0.01;

/// Longest step in its unit of time or depth, and times that the unit may be changed, by `2^-20`, where coefficients overflow: a unit of
/// nothing would have the series of a standstill.
const SPAN_MAX: f64 = 64.0;
const RESCALED_MAX: u32 = 40;

/// Share of the velocity's root that a step by velocity must take to be taken without asking for one by time or depth; and
/// behind another such step.
const ENOUGH: f64 = 0.3;
const STILL_ENOUGH: f64 = 0.05;

/// Lengths of a step that are tried by integrals before a series is, where V falls to rest and where it falls by shares: the poles of
/// `1/F` decide.
const TRIED_TO_REST: [f64; 3] = [1.0, 0.85, 0.5];
const TRIED_BY_SHARES: [f64; 3] = [10.0, 3.0, 1.0];

/// Part by which the force departs from one power of V, and from a logarithm of it, above which the longest length by shares is not worth
/// a trial: two terms of unlike powers put a pole of 1/F next to the step.
const BENT: f64 = 1e-2;

/// Radius of the disc on which a force must have a bound, over the length of a step by series, and over half of one by integrals. An error
/// of 22 coefficients falls as 2.5^-22, and that of the rule, whose ellipse has these half axes in it, as 2.6^-48. With fewer coefficients the
/// first radius is greater, so that as little is left out, or the tolerance.
const DISC_OF_SERIES: f64 = 2.5;
const DISC_OF_INTEGRAL: f64 = 1.5;

/// Step, over depth and the energy at impact, on which nothing is taken to hide: a force that ends in a root has no bound on any.
const SHORT: f64 = 1e-9;

/// Energy that a flight lacks to get to the limit, over its error bound, above which it comes to rest before.
const DECIDED: f64 = 4.0;

/// Share of the energy that is nothing.
const NOTHING: f64 = 1e-18;

/// How far apart, relatively, the roots of two switches may be that are one place.
const SAME_PLACE: f64 = 1e-9;

/// Corrections of a root in the number type.
const CORRECTIONS: usize = 4;

/// Series of one step over its variable s: depth (m), velocity (m/s), time since its start (s).
#[derive(Clone)]
struct Path<S, const K: usize> {
    depth: [S; K],
    velocity: [S; K],
    time: [S; K],
    form: Form,
    /// Length of the step in s.
    span: f64,
    /// Time before the step (s).
    before: f64,
}

/// Which variable a step goes by.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    /// Time, in a unit of so many seconds.
    Time(f64),
    /// Depth, in a unit of so many metres.
    Depth(f64),
    /// The velocity, which falls so.
    Velocity(Fall),
}

impl Form {
    /// Share of the velocity, or of its root, that a step of `span` takes.
    fn share(self, span: f64) -> f64 {
        match self {
            Self::Velocity(Fall::Exponential) => 1.0 - (-span).exp(),
            _ => span,
        }
    }
}

/// What ends a step.
#[derive(Clone, Copy, PartialEq)]
enum Event {
    None,
    Limit,
    Rest,
    Condition,
}

/// Switches, by their places among [`Bound::switches`].
type Kinks = SmallVec<[usize; 2]>;

/// A step on which the equation holds.
struct Held<'l, S, const K: usize> {
    path: Solution<'l, S, K>,
    /// The switches at whose roots it ends.
    kinks: Kinks,
    ending: Ending<S>,
    /// What the step leaves out, relative to the velocity, beyond roundings.
    left_out: f64,
}

/// The solution on a step.
enum Solution<'l, S, const K: usize> {
    Series(Path<S, K>),
    /// Of a force of the velocity alone, to this length in s, with the state there, its time since the start of the step.
    Integrals(Integrals<'l, S>, f64, State<S>),
    /// Of a force `p(x) + q(x) V²`, its length 1.
    Stretch(Stretch<'l, S>),
}

/// The place of a step at which it ends, and how.
type Ending<S> = (S, Event);

/// `c[0] + c[1] s + ...`, by four chains at once: each waits for its last product, none for another.
fn value<S: Scalar>(coefficients: &[S], s: S) -> S {
    let s2 = s * s;
    let s4 = s2 * s2;
    let mut sums = [S::zero(); 4];
    for four in coefficients.chunks(4).rev() {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum = *sum * s4 + four.get(lane).copied().unwrap_or(S::zero());
        }
    }
    (sums[0] + s2 * sums[2]) + s * (sums[1] + s2 * sums[3])
}

/// Its derivative.
fn slope<S: Scalar>(coefficients: &[S], s: S) -> S {
    let terms = coefficients.iter().enumerate().skip(1).rev();
    terms.fold(S::zero(), |sum, (k, c)| sum * s + *c * S::from_f64(k as f64))
}

/// What the roundings of the series at `s` may come to.
fn rounding_of<S: Scalar>(series: &[S], s: f64) -> f64 {
    16.0 * f64::EPSILON * series.iter().rev().fold(0.0, |sum, c| sum * s + c.value().abs())
}

/// Value and slope of a series, as numbers; four chains each, as [`value`].
fn both<S: Scalar>(series: &[S], s: f64) -> (f64, f64) {
    let s2 = s * s;
    let s4 = s2 * s2;
    // Of `a_j(s^4)` and its derivative by `s^4`, where the series is the sum of `s^j a_j(s^4)`.
    let (mut sums, mut slopes) = ([0.0; 4], [0.0; 4]);
    for four in series.chunks(4).rev() {
        for lane in 0..4 {
            slopes[lane] = slopes[lane] * s4 + sums[lane];
            sums[lane] = sums[lane] * s4 + four.get(lane).map_or(0.0, |c| c.value());
        }
    }
    let value = (sums[0] + s2 * sums[2]) + s * (sums[1] + s2 * sums[3]);
    let inner = (slopes[0] + s2 * slopes[2]) + s * (slopes[1] + s2 * slopes[3]);
    (value, sums[1] + s * (2.0 * sums[2] + 3.0 * s * sums[3]) + 4.0 * s2 * s * inner)
}

/// First root on `(0, span]` of a series that is above zero on `side` before it, and whether it only falls until there, or until the
/// end.
///
/// Where it only falls, the sign at the end decides: on all of the step, or on a first part of it that ends behind the root.
fn first_fall<S: Scalar, const K: usize>(series: &[S; K], side: f64, span: f64) -> (Option<f64>, bool) {
    let values = series.map(Scalar::value);
    let rest = values[1..].iter().rev().fold(0.0, |sum, c| (sum + c.abs()) * span);
    // A switch may have no series where the force has one.
    if values[0].abs() > rest || !rest.is_finite() {
        return (None, false);
    }
    let mut slopes = [0.0; K];
    for k in 1..K {
        slopes[k - 1] = side * k as f64 * values[k];
    }
    let fallen = |s: f64| {
        let (value, slope) = both(series, s);
        (-side * value, -side * slope)
    };
    let is_above = side * values[0] > 0.0;
    let first_part =
        FIRST_PARTS.into_iter().find(|part| is_above && locate::is_negative(&slopes[..K - 1], part * span));
    match first_part.map(|part| part * span) {
        Some(end) if fallen(end).0 >= 0.0 => (Some(root_before(fallen, end)), true),
        Some(end) if end == span => (None, true),
        _ => (locate::first_root(&values, span), false),
    }
}

impl<S: Scalar, const K: usize> Path<S, K> {
    fn start(form: Form, at: State<S>) -> Self {
        let zero = [S::zero(); K];
        let before = at.time.value();
        let mut path = Self { depth: zero, velocity: zero, time: zero, form, span: 0.0, before };
        (path.depth[0], path.velocity[0]) = (at.depth, at.velocity);
        path
    }

    /// The first `count` coefficients over time in units of `unit` (s), from those that `force` makes of the ones of x and V.
    #[inline(always)]
    fn over_time(
        start: State<S>,
        mass: S,
        form: Form,
        unit: S,
        count: usize,
        mut force: impl FnMut(S, S) -> S,
    ) -> Self {
        let mut path = Self::start(form, start);
        path.time[1] = unit;
        let rate = unit.over(mass);
        for k in 0..count {
            let force = force(path.depth[k], path.velocity[k]);
            if k + 1 < K {
                let share = reciprocal(k + 1);
                path.depth[k + 1] = unit * path.velocity[k] * share;
                path.velocity[k + 1] = -(rate * force * share);
            }
        }
        path
    }

    /// The series over depth in units of `unit` (m).
    fn over_depth(start: State<S>, mass: S, unit: f64, mut force: impl FnMut(S, S) -> S) -> Self {
        let mut path = Self::start(Form::Depth(unit), start);
        path.depth[1] = S::from_f64(unit);
        let inverse = S::one().over(start.velocity);
        let rate = S::from_f64(unit).over(mass);
        // 1/V.
        let mut slowness = [S::zero(); K];
        slowness[0] = inverse;
        for k in 0..K {
            let force = force(path.depth[k], path.velocity[k]);
            let next = k + 1;
            if next < K {
                let share = reciprocal(next);
                path.time[next] = S::from_f64(unit) * slowness[k] * share;
                let v = &mut path.velocity;
                let known = product(&v[1..next], &v[1..next]);
                v[next] = -((rate * force * share + known * S::from_f64(0.5)) * inverse);
                slowness[next] = -(product(&v[1..=next], &slowness[..next]) * inverse);
            }
        }
        path
    }

    /// The series over a velocity that falls so, under a force that resists.
    #[inline(always)]
    fn over_velocity(start: State<S>, mass: S, fall: Fall, mut force: impl FnMut(S, S) -> S) -> Self {
        let mut path = Self::start(Form::Velocity(fall), start);
        for k in 1..K {
            path.velocity[k] = fall.coefficient(k, 1.0, path.velocity[k - 1]);
        }
        // -M dV/ds.
        let rate: [S; K] = std::array::from_fn(|k| match fall {
            Fall::Exponential => mass * path.velocity[k],
            Fall::Power(_) if k + 1 < K => -(mass * path.velocity[k + 1] * S::from_f64((k + 1) as f64)),
            Fall::Power(_) => S::zero(),
        });
        // That of the side chosen: at a switch the other one has the same value, and in dual numbers another slope.
        let mut inverse = S::zero();
        let mut forces = [S::zero(); K];
        // dt/ds.
        let mut pace = [S::zero(); K];
        for k in 0..K {
            forces[k] = force(path.depth[k], path.velocity[k]);
            if k == 0 {
                inverse = S::one().over(forces[0]);
            }
            pace[k] = (rate[k] - product(&forces[1..=k], &pace[..k])) * inverse;
            if k + 1 < K {
                let share = reciprocal(k + 1);
                // V has m + 1 coefficients, or all.
                let terms = if let Fall::Power(m) = fall { k.min(m as usize) } else { k };
                let advance = product(&path.velocity[..=terms], &pace[k - terms..=k]);
                path.time[k + 1] = pace[k] * share;
                path.depth[k + 1] = advance * share;
            }
        }
        path
    }

    /// The state at `s`, its time since the start of the step.
    fn at(&self, s: S) -> State<S> {
        let velocity = match self.form {
            Form::Time(_) | Form::Depth(_) => value(&self.velocity, s),
            // By its formula: the series cancels towards rest.
            Form::Velocity(fall) => self.velocity[0] * fall.left(s),
        };
        let time = match self.form {
            Form::Time(unit) => s * S::from_f64(unit),
            Form::Depth(_) | Form::Velocity(_) => value(&self.time, s),
        };
        State { time, depth: value(&self.depth, s), velocity }
    }

    /// Where a step over depth meets the limit.
    fn limit_over_depth(&self, limit: S) -> Option<S> {
        let Form::Depth(unit) = self.form else { return None };
        let end = (limit - self.depth[0]).over(S::from_f64(unit));
        (end.value() <= self.span).then_some(end)
    }

    /// What is left of the velocity at its end.
    fn speed_left(&self) -> f64 {
        self.at(S::from_f64(self.span)).velocity.value()
    }

    /// Whether the velocity falls at its end.
    fn slows_at_its_end(&self) -> bool {
        both(&self.velocity, self.span).1 < 0.0
    }

    /// What depth (m) and time (s) of a step by velocity are compared with: their change, and where V falls by shares what they
    /// are, since each step adds less to it.
    fn scales(&self) -> (f64, f64) {
        let (depth, time) = (self.depth[1].value(), self.time[1].value());
        match self.form {
            Form::Velocity(Fall::Exponential) => (depth + self.depth[0].value(), time + self.before),
            _ => (depth, time),
        }
    }

    /// The longest span whose last two terms are within `tolerance` of what they are compared with.
    fn spanned(mut self, tolerance: f64) -> Self {
        let of = |series: &[S; K], scale: f64| {
            let goal = rough_log2(tolerance * scale);
            let by = |k: usize| (goal - rough_log2(series[k].value())) * (1.0 / k as f64);
            rough_exp2(by(K - 1).min(by(K - 2)))
        };
        let (speed, (depth, time)) = (self.velocity[0].value(), self.scales());
        self.span = match self.form {
            Form::Time(_) => of(&self.velocity, speed).min(SPAN_MAX),
            Form::Depth(_) => of(&self.velocity, speed).min(of(&self.time, time)).min(SPAN_MAX),
            Form::Velocity(Fall::Power(_)) => of(&self.depth, depth).min(of(&self.time, time)).min(1.0),
            Form::Velocity(Fall::Exponential) => of(&self.depth, depth).min(of(&self.time, time)).min(SPAN_MAX),
        };
        self
    }

    fn is_finite(&self) -> bool {
        // No early end: three series at once have none to wait for.
        let are = |series: &[S; K]| series.iter().fold(true, |are, c| are & c.value().is_finite());
        are(&self.depth) & are(&self.velocity) & are(&self.time)
    }

    /// What the equation lacks at `s`, over the span and over the quantity that it changes.
    fn defect(&self, s: f64, law: &Law<S>, mass: f64) -> f64 {
        let (velocity, rate) = both(&self.velocity, s);
        let velocity = match self.form {
            Form::Time(_) | Form::Depth(_) => velocity,
            Form::Velocity(fall) => self.velocity[0].value() * fall.left(s),
        };
        let force = law.force_value(both(&self.depth, s).0, velocity);
        match self.form {
            Form::Time(unit) => (rate + force / mass * unit).abs() * self.span / self.velocity[0].value(),
            Form::Depth(unit) => {
                let start = self.velocity[0].value();
                let of_energy = (rate * velocity + force / mass * unit).abs() / start / start;
                let of_time = (both(&self.time, s).1 * velocity / unit - 1.0).abs();
                of_energy.max(of_time) * self.span
            }
            Form::Velocity(fall) => {
                let falling = fall.slope(s);
                let rate = mass * self.velocity[0].value() * falling / force;
                let (_, scale) = self.scales();
                // At rest both vanish, and their quotient is the force's.
                if falling == 0.0 {
                    return 0.0;
                }
                (both(&self.time, s).1 - rate).abs() * self.span / scale
            }
        }
    }

    /// Rounding that the defect has by itself: of the force, and of the sum.
    fn noise(&self, force: f64, mass: f64) -> f64 {
        let of = |series: &[S], first: usize| {
            let largest = series.iter().enumerate().skip(first).rev();
            largest.fold(0.0, |sum, (k, c)| sum * self.span + k as f64 * c.value().abs())
        };
        let (speed, (_, pace)) = (self.velocity[0].value(), self.scales());
        let lost = |unit: f64| force.abs() / mass * unit * self.span;
        match self.form {
            Form::Time(unit) => (of(&self.velocity, 0) + lost(unit)) / speed,
            Form::Depth(unit) => (of(&self.velocity, 0) + lost(unit) / speed) / speed + of(&self.time, 0) / pace,
            Form::Velocity(_) => of(&self.time, 1) / pace,
        }
    }
}

impl<S: Scalar, const K: usize> Solution<'_, S, K> {
    /// Its length in s.
    fn span(&self) -> f64 {
        match self {
            Self::Series(path) => path.span,
            Self::Integrals(_, span, _) => *span,
            Self::Stretch(_) => 1.0,
        }
    }

    /// The state at `s`, its time since the start of the step.
    fn at(&self, s: S) -> State<S> {
        match self {
            Self::Series(path) => path.at(s),
            Self::Integrals(integrals, ..) => integrals.at(s),
            Self::Stretch(stretch) => stretch.at(s),
        }
    }

    /// Where on the way to `end` so much time (s) has passed `since` the start.
    fn moment(&self, since: f64, end: f64) -> f64 {
        match self {
            Self::Series(path) => match path.form {
                Form::Time(unit) => since / unit,
                Form::Depth(_) | Form::Velocity(_) => {
                    let passed = |s| {
                        let (time, pace) = both(&path.time, s);
                        (time - since, pace)
                    };
                    root_before(passed, end)
                }
            },
            Self::Integrals(integrals, ..) => integrals.moment(since, end),
            Self::Stretch(stretch) => stretch.moment(since, end),
        }
    }

    /// The least velocity on the way to `end`, where it is none of its ends.
    fn least_inside(&self, end: f64) -> Option<f64> {
        match self {
            Self::Series(path) => least_inside(path, end),
            Self::Integrals(..) | Self::Stretch(_) => None,
        }
    }

    /// Whether the velocity falls all along.
    fn only_falls(&self) -> bool {
        match self {
            Self::Series(path) => matches!(path.form, Form::Velocity(_)),
            Self::Integrals(..) | Self::Stretch(_) => true,
        }
    }
}

/// A stage in progress.
struct Walk<'l, S, const K: usize> {
    law: &'l Law<S>,
    /// Its expression.
    bound: &'l Bound<S>,
    mass: S,
    /// (m/s)
    impact_speed: f64,
    /// Radius of the disc on which the force must have a bound, over the length of a step.
    disc: f64,
    jets: Jets<S>,
    /// The side of each switch on this step.
    sides: SmallVec<[bool; 4]>,
    /// How the velocity falls where it is the variable, on these sides.
    falling: Arc<Falling>,
    /// The switches at whose roots this step starts.
    kinks: Kinks,
    /// Whether the step before went by velocity.
    goes_by_velocity: bool,
    /// How long a step by integrals over depth may be (m), behind another such step.
    stretched: Option<f64>,
    /// The force where the step before ended.
    reached: Option<Local<S>>,
    /// What a step goes by that does not go by velocity.
    variable: Variable,
    tolerance: f64,
    /// The condition that ends the stage, and the sign of g on the way to it.
    end: Option<(&'l Condition<S>, f64)>,
    /// Whether the force is one of the velocity alone.
    is_of_velocity: bool,
}

/// Series at the start of a step that are made already, the last of them with the jets of its stage.
struct Made<S, const K: usize> {
    by_velocity: Option<Path<S, K>>,
    by_time: Option<Path<S, K>>,
}

impl<S, const K: usize> Default for Made<S, K> {
    fn default() -> Self {
        Self { by_velocity: None, by_time: None }
    }
}

/// How a step begins.
enum Begun<S> {
    /// Nothing is left of the stage.
    Ended(StageEnd<S>),
    /// Here.
    At(Local<S>),
}

/// The force at a state, and `F_V` (kg/s) where it is below zero, else zero.
#[derive(Clone, Copy)]
struct Local<S> {
    force: S,
    fall: f64,
}

/// What a step goes by, where it does not go by velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variable {
    /// Time.
    Time,
    /// Depth.
    Depth,
}

/// How a method solves stages with laws of their own.
#[derive(Clone, Copy, Debug)]
pub(super) struct LawSeries {
    /// Its name.
    pub(super) method: &'static str,
    pub(super) variable: Variable,
    /// Truncation error of a step, relative to the velocity.
    pub(super) tolerance: f64,
}

impl<S: Scalar> StageSolver<S> for LawSeries {
    fn solve_stage(&mut self, course: &mut Course<'_, S>) -> Solved<StageEnd<S>> {
        let limit = course.limit()?;
        let Some(law) = course.law() else {
            let why = "the stage has coefficients and no law of its own".to_owned();
            return Err(IntegrationError::Refused { method: self.method, why });
        };
        self.solve(course, law, limit)
    }
}

impl LawSeries {
    /// Solves the present stage, of `law`, up to `limit`.
    #[inline(never)]
    pub(super) fn solve<S: Scalar>(self, course: &mut Course<'_, S>, law: &Law<S>, limit: S) -> Solved<StageEnd<S>> {
        if Precision::<S>::IS_SINGLE {
            return self.solve_by::<S, 12>(course, law, limit);
        }
        if !Precision::<S>::IS_DOUBLE {
            return self.solve_by::<S, 40>(course, law, limit);
        }
        // As in `taylor`.
        match self.tolerance {
            tolerance if tolerance > 1e-5 => self.solve_by::<S, 8>(course, law, limit),
            tolerance if tolerance > 1e-9 => self.solve_by::<S, 12>(course, law, limit),
            tolerance if tolerance > 1e-13 => self.solve_by::<S, 16>(course, law, limit),
            _ => self.solve_by::<S, 22>(course, law, limit),
        }
    }

    /// The same by series of K coefficients.
    fn solve_by<S: Scalar, const K: usize>(
        self,
        course: &mut Course<'_, S>,
        law: &Law<S>,
        limit: S,
    ) -> Solved<StageEnd<S>> {
        let mut walk = self.walk::<S, K>(course, law)?;
        loop {
            if let Some(end) = walk.step(course, limit)? {
                return Ok(end);
            }
        }
    }

    /// The present stage, of `law`, about to begin.
    fn walk<'l, S: Scalar, const K: usize>(self, course: &Course<'_, S>, law: &'l Law<S>) -> Solved<Walk<'l, S, K>> {
        let Some(bound) = law.bound() else {
            let why = "a law in code has no series; take --method adaptive".to_owned();
            return Err(IntegrationError::Refused { method: self.method, why });
        };
        let sides = SmallVec::from_elem(false, bound.switches().len());
        Ok(Walk {
            law,
            bound,
            falling: bound.falling(&sides),
            mass: course.mass,
            impact_speed: course.problem.impact_speed.value(),
            disc: DISC_OF_SERIES.max(DISC_OF_SERIES.powi(22).min(self.tolerance.recip()).powf(1.0 / K as f64)),
            end: law.end().map(|end| (end, end.side(course.state))),
            jets: Jets::default(),
            sides,
            kinks: Kinks::new(),
            goes_by_velocity: false,
            stretched: None,
            reached: None,
            variable: self.variable,
            tolerance: self.tolerance,
            is_of_velocity: law.is_of_velocity(),
        })
    }
}

impl<'l, S: Scalar, const K: usize> Walk<'l, S, K> {
    /// One step from the state of `course`; how the stage ends, if it does.
    fn step(&mut self, course: &mut Course<'_, S>, limit: S) -> Solved<Option<StageEnd<S>>> {
        match self.begin(course, limit)? {
            Begun::Ended(end) => Ok(Some(end)),
            Begun::At(here) => self.go_on(course, limit, here, Made::default()),
        }
    }

    /// Begins a step: the force at its start, and the sides of the switches on it.
    fn begin(&mut self, course: &Course<'_, S>, limit: S) -> Solved<Begun<S>> {
        let start = course.state;
        if course.cost.steps >= STEPS_MAX {
            let remedy = "give the target or the stage an end, or take --method adaptive";
            return Err(IntegrationError::StepBudgetSpent { max_steps: STEPS_MAX, remedy, last: start.values() });
        }
        let here = self.reached.take().unwrap_or_else(|| self.local(start));
        let force = here.force;
        if !force.value().is_finite() {
            return Err(self.no_force(course, start));
        }
        if let Some(end) = self.end_of_slow(course, force, limit) {
            return Ok(Begun::Ended(end));
        }
        let is_endless = limit.value() == f64::INFINITY && self.end.is_none();
        if is_endless && force.value() < 0.0 && self.law.never_slows(start.depth.value()) {
            return Err(IntegrationError::NeverEnds { why: DRIVES, last: start.values() });
        }
        self.choose_sides(start, force, limit);
        Ok(Begun::At(here))
    }

    /// How the series goes that the step asks for next, beside those that are `made`.
    fn asks(&self, start: State<S>, force: S, limit: S, made: &Made<S, K>) -> Option<Form> {
        let is_enough = |path: &Path<S, K>| {
            let path = self.spanned_by_velocity(path.clone(), start);
            path.is_some_and(|path| self.is_enough(&path, limit))
        };
        match (&made.by_velocity, &made.by_time) {
            (None, None) if self.may_go_by_velocity(force) => Some(Form::Velocity(self.falling.fall)),
            (Some(path), None) if is_enough(path) => None,
            (_, None) => Some(Form::Time(time_unit(start, force, self.mass, limit))),
            (_, Some(_)) => None,
        }
    }

    /// The step that has begun; its first series may be `made` already.
    fn go_on(
        &mut self,
        course: &mut Course<'_, S>,
        limit: S,
        here: Local<S>,
        made: Made<S, K>,
    ) -> Solved<Option<StageEnd<S>>> {
        let (start, force) = (course.state, here.force);
        let held = self.integrated(start, force, limit).map_or_else(|| self.held(course, force, limit, made), Ok);
        let Held { path, kinks, ending: (s, event), left_out } = match held {
            Err(IntegrationError::NoForce { last, .. }) if last == start.values() => {
                let next = self.leave_branch_point(start, force, limit).ok_or_else(|| self.no_force(course, start))?;
                course.cost.steps += 1;
                course.cost.force_evaluations += K as u64;
                self.reached = Some(self.widen_bound(course, here, (start, next), self.tolerance));
                course.sample_until(next, |time| State { time: S::from_f64(time), ..start });
                self.kinks.clear();
                course.state = next;
                return Ok(None);
            }
            other => other?,
        };
        let (evaluations, (s, event, closeness)) = match &path {
            Solution::Series(path) => (K, self.first_zero(path, s, event)),
            Solution::Integrals(..) => (PLACES, (s, event, None)),
            Solution::Stretch(stretch) => (stretch.evaluations, (s, event, None)),
        };
        course.cost.force_evaluations += evaluations as u64;
        let local = match path {
            Solution::Integrals(_, _, end) if event != Event::Limit => end,
            _ => path.at(s),
        };
        let next = State {
            time: start.time + local.time,
            depth: if event == Event::Limit { limit } else { local.depth },
            velocity: if event == Event::Rest || local.velocity.value() < 0.0 { S::zero() } else { local.velocity },
        };
        let next = match self.end {
            Some((end, _)) if event == Event::Condition => {
                let depth = if next.depth.value() > limit.value() { limit } else { next.depth };
                end.at_end(State { depth, ..next })
            }
            _ => next,
        };
        if !next.is_finite() {
            return Err(IntegrationError::NotFinite { what: "the state", last: start.values() });
        }
        course.cost.steps += 1;
        let reached = self.widen_bound(course, here, (start, next), left_out);
        // A step by velocity can only end at the least one.
        let is_at_least = path.only_falls() && reached.force.value() < 0.0;
        let least = if is_at_least { Some(next.velocity.value()) } else { path.least_inside(s.value()) };
        if let Some(least) = least {
            course.pass_least(least);
        }
        if let Some((place, closeness)) = closeness {
            self.doubt(course, path.at(S::from_f64(place)), closeness);
        }
        course.sample_until(next, |time| {
            let s = path.moment(time - start.time.value(), s.value());
            let local = path.at(S::from_f64(s));
            State { time: S::from_f64(time), ..local }
        });
        Ok(match event {
            Event::None => {
                self.kinks = if s.value() >= path.span() { kinks } else { Kinks::new() };
                self.reached = Some(reached);
                course.state = next;
                course.sample(next);
                None
            }
            Event::Limit => Some(StageEnd::Limit(next)),
            Event::Condition => Some(StageEnd::Condition(next)),
            Event::Rest => Some(StageEnd::Rest(next)),
        })
    }

    fn local(&self, at: State<S>) -> Local<S> {
        let State { depth, velocity, .. } = at.values();
        Local { force: self.law.force(at.depth, at.velocity), fall: self.law.fall_over_velocity(depth, velocity) }
    }

    /// The error where the force has no value.
    fn no_force(&self, course: &Course<'_, S>, at: State<S>) -> IntegrationError {
        let last = at.values();
        let why = self.law.explain(last.depth, last.velocity);
        IntegrationError::NoForce { stage: course.stage, why, last }
    }

    /// The state behind a place at which the force has a value and no series over depth: `F = F0 + a d^p` at the distance d.
    ///
    /// `W = W0 - 2 (F0 d + a d^(p+1)/(p+1))/M`, and the time is the integral of `1/V` to the first order of what W loses.
    /// `None` where the force is of another kind.
    fn leave_branch_point(&self, start: State<S>, force: S, limit: S) -> Option<State<S>> {
        let (x, v, mass) = (start.depth.value(), start.velocity.value(), self.mass.value());
        let excess = |distance: f64| self.law.force_value(x + distance, v) - force.value();
        let power = |distance: f64| (excess(distance) / excess(0.5 * distance)).log2();
        self.bound.explain_series(x, v)?;
        let longest = (limit.value() - x).min(v * time_unit(start, force, self.mass, limit));
        for trial in 0..BRANCH_TRIALS {
            let distance = longest * 0.125_f64.powi(trial);
            let share = |force: f64| force.abs() * distance / (mass * v * v);
            // Of a power above two next to nothing is left so close to its root.
            let is_flat = excess(distance).abs() <= 4.0 * f64::EPSILON * force.value().abs();
            let p = if is_flat { 1.0 } else { power(distance) };
            let lost = if is_flat { 0.0 } else { share(excess(distance)) * (p - power(0.5 * distance)).abs() };
            let is_little = share(force.value().abs() + excess(distance).abs()) <= BRANCH_SHARE;
            if !(p > 0.0 && is_little && x + distance > x && lost <= f64::EPSILON / 16.0) {
                continue;
            }
            let d = S::from_f64(distance);
            let more = self.law.force(start.depth + d, start.velocity) - force;
            let part = |order: f64| S::one().over(S::from_f64(order));
            let work = (force + more * part(p + 1.0)) * d;
            let work_twice = (force * part(2.0) + more * part((p + 1.0) * (p + 2.0))) * d * d;
            let energy = self.mass * start.velocity * start.velocity;
            return Some(State {
                time: start.time + (d + work_twice.over(energy)).over(start.velocity),
                depth: start.depth + d,
                velocity: (start.velocity * start.velocity - S::from_f64(2.0) * work.over(self.mass)).sqrt(),
            });
        }
        None
    }

    /// The end of a flight that is as good as over: rest within the digits of the present state, or an approach.
    fn end_of_slow(&self, course: &Course<'_, S>, force: S, limit: S) -> Option<StageEnd<S>> {
        let State { time, depth, velocity } = course.state;
        let (v, x) = (velocity.value(), depth.value());
        // A bound may outgrow the energy of a flight that is fast: it goes on.
        let relative = v / course.problem.impact_speed.value();
        if relative > SLOW {
            return None;
        }
        // In values: other number types have no infinity.
        let at_rest = self.law.force_value(x, 0.0);
        let deceleration = force.over(self.mass);
        let rest = State {
            time: time + velocity.over(deceleration),
            depth: depth + velocity * velocity.over(deceleration) * S::from_f64(0.5),
            velocity: S::zero(),
        };
        let resists = at_rest > 0.0 && force.value() > 0.0;
        let is_before = rest.depth.value() < limit.value();
        let to_rest = 0.5 * self.mass.value() * v * v / force.value().abs();
        // Behind a drive the bound may go beyond all numbers before the velocity does. Without a far side no margin says what is
        // undecided: the flight goes on, to its rest or for ever.
        let has_margin = course.problem.has_exit() && course.error_bound < f64::INFINITY;
        let is_lost = has_margin && relative * relative <= course.error_bound && !(to_rest <= NEAR_REST * x);
        // What drives it, however uncertain its speed, brings it to no rest.
        if is_lost && resists {
            // The energy is lost in its error bound, and no force ends it soon: the margin says what that decides. Where it would take more
            // than is lost to get to the limit, the rest is still to be found.
            let (_, ahead) = self.law.static_work(x, limit.value());
            let needed = 2.0 * ahead / self.mass.value() / course.problem.impact_speed.value().powi(2);
            if !(is_before && needed > DECIDED * course.error_bound) {
                let still_resists = is_before && self.law.force_value(rest.depth.value(), 0.0) > 0.0;
                let present = State { velocity: S::zero(), ..course.state };
                return Some(StageEnd::Rest(if still_resists { rest } else { present }));
            }
        }
        if resists {
            // A force without bound at rest ends it before the present one would.
            let rises = (at_rest / force.value() - 1.0).abs().max(0.01);
            let change = if at_rest == f64::INFINITY { 1.0 } else { rises };
            let is_over = (rest.depth.value() - x) * change <= 0.25 * f64::EPSILON * x
                && (rest.time - time).value() * change <= f64::EPSILON * time.value();
            return (is_over && is_before).then_some(StageEnd::Rest(rest));
        }
        if at_rest == 0.0 && v <= VANISHING * course.problem.impact_speed.value() && self.law.stops(x, v) {
            let rest = rest_by_power(course.state, deceleration, self.law.power(x, v));
            return (rest.depth.value() < limit.value()).then_some(StageEnd::Rest(rest));
        }
        let reach = |law: &Law<S>| x + law.reach(self.mass.value(), course.state.values()).min(limit.value() - x);
        let may_end = self.end.is_some_and(|(end, _)| end.may_vanish((x, reach(self.law)), (0.0, v)));
        let is_approach = !may_end && self.law.is_approach(self.mass.value(), course.state.values(), limit.value() - x);
        is_approach.then_some(StageEnd::Approach(course.state, VANISHES))
    }

    /// Chooses the side of each switch ahead.
    fn choose_sides(&mut self, start: State<S>, force: S, limit: S) {
        if self.sides.is_empty() {
            return;
        }
        let values = self.bound.switch_values(start.depth, start.velocity);
        let chosen = values.iter().map(|value| value.value() > 0.0).collect();
        let before = std::mem::replace(&mut self.sides, chosen);
        let is_at_root = |side: usize| self.kinks.contains(&side) || values[side].is_zero();
        let at_roots: Kinks = (0..values.len()).filter(|side| is_at_root(*side)).collect();
        // A single switch of V alone leaves its root as V falls.
        let slope = if let ([side], true) = (&at_roots[..], self.is_of_velocity && self.may_integrate(force)) {
            Some((*side, self.law.switch_over_velocity(*side, start.velocity.value()).1))
        } else {
            None
        };
        if let Some((side, slope)) = slope.filter(|(_, slope)| *slope != 0.0 && slope.is_finite()) {
            self.sides[side] = slope < 0.0;
        } else if !at_roots.is_empty() {
            let unit = time_unit(start, force, self.mass, limit);
            // Two rounds: the slope of a switch that stands at zero may depend on the side of another.
            for _ in 0..2 {
                self.over_time(start, unit, 4);
                for (side, register) in self.bound.switches().iter().enumerate() {
                    let series = self.jets.register(*register);
                    let known = if self.kinks.contains(&side) { &series[1..4] } else { &series[..4] };
                    let first = known.iter().map(|c| c.value()).find(|c| *c != 0.0);
                    self.sides[side] = first.unwrap_or(0.0) > 0.0;
                }
            }
        }
        if self.sides != before {
            self.falling = self.bound.falling(&self.sides);
        }
    }

    /// Whether a step under this force may go by integrals.
    fn may_integrate(&self, force: S) -> bool {
        self.variable == Variable::Time && S::EPSILON == f64::EPSILON && force.value() > 0.0
    }

    /// A step by integrals, where the force is of one of their kinds and a few places show it.
    fn integrated(&mut self, start: State<S>, force: S, limit: S) -> Option<Held<'l, S, K>> {
        if !self.may_integrate(force) || self.end.is_some() {
            return None;
        }
        if self.is_of_velocity { self.over_velocities(start, limit) } else { self.over_depths(start, limit) }
    }

    /// A step over depth, of a force `p(x) + q(x) V²`.
    fn over_depths(&mut self, start: State<S>, limit: S) -> Option<Held<'l, S, K>> {
        let ahead = Ahead { parts: self.law.by_square_of_v()?, mass: self.mass, start };
        let stretch = ahead.stretch(limit, self.stretched.take())?;
        self.stretched = Some(stretch.next);
        self.goes_by_velocity = false;
        let event = match stretch.way {
            Way::Through(_) => Event::None,
            Way::ToLimit(_) => Event::Limit,
            Way::ToRest(_) => Event::Rest,
        };
        let left_out = stretch.left_out;
        Some(Held { path: Solution::Stretch(stretch), kinks: Kinks::new(), ending: (S::one(), event), left_out })
    }

    /// A step over the velocity, of a force of it alone.
    fn over_velocities(&mut self, start: State<S>, limit: S) -> Option<Held<'l, S, K>> {
        let integrals = Integrals::new(self.bound, self.mass, start, Arc::clone(&self.falling));
        let tried = match self.falling.fall {
            Fall::Exponential if self.is_bent(&integrals) => &TRIED_BY_SHARES[1..],
            Fall::Exponential => &TRIED_BY_SHARES,
            Fall::Power(_) => &TRIED_TO_REST[..],
        };
        for &longest in tried {
            let (mut span, mut kinks) = (longest, Kinks::new());
            if let Some((root, switches)) = self.first_departure(&integrals, span) {
                (span, kinks) = (root, switches);
            }
            let forces = integrals.forces(S::from_f64(span));
            let keeps = |(side, register): (usize, &usize)| {
                forces.keeps(*register, self.sides[side], self.kinks.contains(&side), kinks.contains(&side))
            };
            if !self.bound.switches().iter().enumerate().all(keeps) {
                continue;
            }
            let Some(left_out) = forces.lacking() else { continue };
            let end = integrals.end(&forces);
            let around = Around::falling(
                Disc::of(start.depth.value()),
                start.velocity.value(),
                &self.falling,
                Disc::new(0.5 * span, DISC_OF_INTEGRAL * 0.5 * span),
            );
            let (disc, switches) = self.bound.discs(around, &self.sides, |register| forces.at_start(register));
            let seen = |switch: usize| Forces::largest(&forces.registers[self.bound.switches()[switch]]);
            let depth = start.depth.value();
            let velocities = (end.velocity.value().max(0.0), start.velocity.value());
            let is_shown = disc.shows(Forces::largest(&forces.force))
                && self.bound.shown(&switches, &self.sides, seen, ((depth, depth), velocities)).is_some();
            if !is_shown {
                continue;
            }
            self.goes_by_velocity = true;
            let is_rest = self.falling.fall != Fall::Exponential && span >= 1.0;
            let ending = if end.depth.value() >= limit.value() {
                (integrals.passage(limit, end, span), Event::Limit)
            } else {
                (S::from_f64(span), if is_rest { Event::Rest } else { Event::None })
            };
            return Some(Held { path: Solution::Integrals(integrals, span, end), kinks, ending, left_out });
        }
        None
    }

    /// Whether the force at s = 0, 1 and 2 is neither a power of V nor a logarithm, nearly.
    fn is_bent(&self, integrals: &Integrals<'_, S>) -> bool {
        let depth = integrals.start.depth.value();
        let [start, one, two] =
            [0.0, 1.0, 2.0].map(|s| self.law.force_value(depth, integrals.velocity(S::from_f64(s)).value()));
        (one * one / (start * two) - 1.0).abs() > BENT && (start - 2.0 * one + two).abs() > BENT * one
    }

    /// The first place at which a switch has left its side by the end of `span`, and the switches that do so there.
    fn first_departure(&self, integrals: &Integrals<'_, S>, span: f64) -> Option<(f64, Kinks)> {
        let at_end = self.bound.switch_values(integrals.start.depth, integrals.velocity(S::from_f64(span)));
        let departure = |(side, value): (usize, &S)| {
            let sign = if self.sides[side] { -1.0 } else { 1.0 };
            let passed = |s: f64| {
                let v = integrals.velocity(S::from_f64(s)).value();
                let (value, slope) = self.law.switch_over_velocity(side, v);
                (sign * value, -sign * slope * integrals.fall_rate(s))
            };
            (sign * value.value() > 0.0).then(|| (side, root_before(passed, span)))
        };
        let roots: SmallVec<[(usize, f64); 4]> = at_end.iter().enumerate().filter_map(departure).collect();
        first_of(&roots)
    }

    /// A step on which the equation holds.
    fn held(&mut self, course: &Course<'_, S>, force: S, limit: S, made: Made<S, K>) -> Solved<Held<'l, S, K>> {
        let start = course.state;
        let by_velocity = self.over_velocity(start, force, made.by_velocity);
        let mut path = match by_velocity {
            Some(path) if self.is_enough(&path, limit) => path,
            other => {
                let free = self.over_time_or_depth(course, force, limit, made.by_time)?;
                match other {
                    // Behind a least velocity, steps by velocity would only approach it.
                    Some(path)
                        if path.speed_left() < free.speed_left()
                            && free.slows_at_its_end()
                            && free.limit_over_depth(limit).is_none() =>
                    {
                        self.over_velocity(start, force, None).unwrap_or(path)
                    }
                    _ => free,
                }
            }
        };
        self.goes_by_velocity = matches!(path.form, Form::Velocity(_));
        // What the force is rounded to: its terms may cancel.
        let size = LazyCell::new(|| {
            let State { depth, velocity, .. } = start.values();
            let (by_depth, by_velocity) = self.law.slopes(depth, velocity);
            let terms = (by_depth * depth).abs() + (by_velocity * velocity).abs();
            force.value().abs() + if terms.is_finite() { terms } else { 0.0 }
        });
        let mut kinks = Kinks::new();
        for _ in 0..SHORTENED_MAX {
            // Behind rest and the limit the equation need not hold, nor the force have a value, and switches grow large there: their roots
            // would be lost in roundings.
            let mut ending = first_event(&path, limit);
            path.span = ending.0.value();
            // Over a longer step the series of a switch may lack roots that the switch has.
            let Some(shown) = self.shown_switches(&path) else {
                path.span *= SHORTENING;
                continue;
            };
            if path.span > 0.0
                && let Some((root, switches)) = self.first_kinks(&path, &shown)
            {
                path.span = root;
                // In front of a root whose place is not known another may lie, which a shorter step shows.
                if switches.is_empty() && !self.is_short(&path, path.at(S::from_f64(root)).values()) {
                    continue;
                }
                (kinks, ending) = (switches, (S::from_f64(root), Event::None));
            }
            let mass = self.mass.value();
            let noise = |force: f64| 16.0 * f64::EPSILON.max(S::EPSILON) * path.noise(force, mass);
            let (least, most) = (noise(force.value()), LazyCell::new(|| noise(*size)));
            // What it lacks there beyond roundings, if that is little enough.
            let lacking = |share: f64| {
                let defect = path.defect(share * path.span, self.law, mass);
                let allowed = DEFECT_MAX * self.tolerance;
                let rounded = if defect <= allowed + least { least } else { *most };
                (defect <= allowed + rounded).then(|| (defect - rounded).max(0.0))
            };
            let sum =
                ASKED.iter().zip(STANDS_FOR).try_fold(0.0, |sum, (share, part)| Some(sum + part * lacking(*share)?));
            let shown =
                if sum.is_some() && self.shows_force(&path, force) { self.shown_end(&path) } else { SHORTENING };
            if let (true, Some(sum)) = (shown >= 1.0, sum) {
                let power = if let Form::Velocity(Fall::Power(m)) = path.form { f64::from(m) } else { 1.0 };
                let left_out = self.tolerance.max(power * sum);
                return Ok(Held { path: Solution::Series(path), kinks, ending, left_out });
            }
            path.span *= shown;
            kinks.clear();
        }
        let end = path.at(S::from_f64(path.span));
        let last = State { time: start.time + end.time, ..end };
        if let Some((condition, _)) = self.end
            && let Some(why) = condition.explain(start.depth.value(), start.velocity.value())
        {
            return Err(IntegrationError::NoEnd { stage: course.stage, why, last: start.values() });
        }
        if self.law.force(end.depth, end.velocity).value().is_finite() {
            return Err(IntegrationError::NotFinite { what: "the step", last: start.values() });
        }
        Err(self.no_force(course, last))
    }

    /// Discs of the force and of the switches around the path that was made last.
    fn discs(&self, path: &Path<S, K>) -> (Disc, SmallVec<[Disc; 4]>) {
        let reach = self.disc * path.span;
        let around = |series: &[S; K]| {
            let radius = series[1..].iter().rev().fold(0.0, |sum, c| (sum + c.value().abs()) * reach);
            Disc::new(series[0].value(), radius)
        };
        let depth = around(&path.depth);
        let around = match path.form {
            Form::Time(_) | Form::Depth(_) => Around { x: depth, v: around(&path.velocity), fall: None },
            Form::Velocity(_) => Around::falling(depth, path.velocity[0].value(), &self.falling, Disc::new(0.0, reach)),
        };
        self.bound.discs(around, &self.sides, |register| self.jets.register(register)[0].value())
    }

    /// Whether the path that was made last is too short for anything to hide on it.
    fn is_short(&self, path: &Path<S, K>, end: State) -> bool {
        let (start, speed) = (path.depth[0].value(), path.velocity[0].value());
        let distance = end.depth - start;
        // Close to rest the energy counts: the velocity may fall to nothing where the force has its root.
        let change = (speed * speed - end.velocity * end.velocity).abs();
        distance > 0.0 && distance <= SHORT * end.depth && change <= SHORT * self.impact_speed * self.impact_speed
    }

    /// Of each switch, whether its series over the path that was made last shows it all along ([`Bound::shown`]).
    fn shown_switches(&self, path: &Path<S, K>) -> Option<SmallVec<[bool; 4]>> {
        let count = self.bound.switches().len();
        if count == 0 {
            return Some(SmallVec::new());
        }
        let end = path.at(S::from_f64(path.span)).values();
        if self.is_short(path, end) {
            return Some(SmallVec::from_elem(true, count));
        }
        let speed = path.velocity[0].value();
        let velocities = (end.velocity.max(0.0).min(speed), end.velocity.max(speed));
        let values = LazyCell::new(|| {
            ASKED.map(|share| {
                let at = path.at(S::from_f64(share * path.span));
                self.bound.switch_values(at.depth, at.velocity)
            })
        });
        let seen = |switch: usize| {
            let values = values.iter().map(|values| values[switch].value().abs());
            values.fold(self.jets.register(self.bound.switches()[switch])[0].value().abs(), f64::max)
        };
        let depths = (path.depth[0].value(), end.depth);
        self.bound.shown(&self.discs(path).1, &self.sides, seen, (depths, velocities))
    }

    /// Whether the series over the path that was made last show its force all along: by its bound on a disc around the start, what they
    /// leave out is of no count.
    fn shows_force(&self, path: &Path<S, K>, force: S) -> bool {
        let end = path.at(S::from_f64(path.span)).values();
        if self.is_short(path, end) {
            return true;
        }
        let (disc, _) = self.discs(path);
        let at_end = self.law.force_value(end.depth, end.velocity.max(0.0)).abs();
        let largest = force.value().abs().max(if at_end.is_finite() { at_end } else { 0.0 });
        let speed = path.velocity[0].value();
        let left_out = disc.size() * self.disc.powi(-(K as i32)) * (end.depth - path.depth[0].value());
        disc.shows(largest) || left_out <= NOTHING * self.mass.value() * speed * speed
    }

    /// The series of g over the path that was made last.
    fn condition_series(&self) -> Option<[S; K]> {
        let mut series = [S::zero(); K];
        match self.bound.beside()? {
            Ok(register) => series.copy_from_slice(&self.jets.register(register)[..K]),
            Err(constant) => series[0] = constant,
        }
        Some(series)
    }

    /// The share of the path on which its series shows where g vanishes: 1 where all of it does.
    fn shown_end(&self, path: &Path<S, K>) -> f64 {
        let (Some((end, side)), Some(series)) = (self.end, self.condition_series()) else { return 1.0 };
        if !self.shows_end(path, end, &series) {
            return SHORTENING;
        }
        let place = |share: f64| {
            let at = path.at(S::from_f64(share * path.span)).values();
            Ok::<_, Infallible>((at.depth, at.velocity.max(0.0)))
        };
        let Ok(sight) = end.look(side, place);
        match sight {
            Sight::Clear => 1.0,
            Sight::Hidden(from, to) => {
                if from > 0.0 {
                    from
                } else {
                    to
                }
            }
            Sight::Crossed(_, to) => {
                let (root, _) = first_fall(&series, side, path.span);
                let is_found = root.is_some_and(|root| root <= to * path.span * (1.0 + 1e-9));
                if is_found { 1.0 } else { to.min(SHORTENING) }
            }
        }
    }

    /// Whether the series of g gives g along the path, and is no sum of numbers far beyond it.
    fn shows_end(&self, path: &Path<S, K>, end: &Condition<S>, series: &[S; K]) -> bool {
        let largest = [0.0].iter().chain(&ASKED).map(|share| {
            let at = path.at(S::from_f64(share * path.span)).values();
            end.value(at.depth, at.velocity.max(0.0)).abs()
        });
        let largest = largest.fold(0.0, f64::max);
        ASKED.iter().all(|share| {
            let s = share * path.span;
            let at = path.at(S::from_f64(s)).values();
            let size = series.iter().rev().fold(0.0, |sum, c| sum * s + c.value().abs());
            let allowed = (DEFECT_MAX * self.tolerance + 64.0 * f64::EPSILON) * size;
            let noise = end.noise(at.depth, at.velocity.max(0.0));
            allowed <= CANCELLED * largest + noise
                && (both(series, s).0 - end.value(at.depth, at.velocity.max(0.0))).abs() <= allowed + noise
        })
    }

    /// `event` at `s`, or the zero of g in front of it. Also where g is nearest to zero, if it is near: a place of the step
    /// and how far g goes beyond zero there, below zero where it does not get there.
    fn first_zero(&self, path: &Path<S, K>, s: S, event: Event) -> (S, Event, Option<(f64, f64)>) {
        let (Some((end, side)), Some(series)) = (self.end, self.condition_series()) else { return (s, event, None) };
        let span = s.value();
        let rest = series[1..].iter().rev().fold(0.0, |sum, c| (sum + c.value().abs()) * span);
        if side * series[0].value() > rest {
            return (s, event, None);
        }
        // Where g turns: the first root of its slope.
        let mut slopes = [0.0; K];
        for k in 1..K {
            slopes[k - 1] = k as f64 * series[k].value();
        }
        let (root, falls) = first_fall(&series, side, span);
        let turn = if falls || slopes.iter().all(|c| *c == 0.0) { None } else { locate::first_root(&slopes, span) };
        if let Some(root) = root {
            // g itself along the path: its terms cancel less than those of its series, which leaves out more than the path does.
            let by_path = |root: f64| {
                let own = end.bound();
                let g = |s| {
                    let at = path.at(s);
                    own.eval(at.depth, at.velocity)
                };
                corrected(S::from_f64(root), span, g, |s| slope(&series, s))
            };
            // A double root is known to half of its digits, the value where g turns to all.
            if let Some(turn) = turn.filter(|turn| *turn >= NEAR_TURN * root) {
                let beyond = -side * both(&series, turn).0;
                let rounding = rounding_of(&series, turn);
                if beyond < -rounding {
                    // It turns before zero: the step goes on to a place where that is plain.
                    let (cut, nearest) = (turn * (1.0 + BEHIND_TURN), Some((turn, beyond)));
                    return if cut < span { (S::from_f64(cut), Event::None, nearest) } else { (s, event, nearest) };
                }
                let passed = |s: f64| {
                    let at = path.at(S::from_f64(s)).values();
                    (-side * end.value(at.depth, at.velocity.max(0.0)), -side * both(&series, s).1)
                };
                let is_hidden = beyond <= rounding;
                let root = if is_hidden { S::from_f64(turn) } else { by_path(root_before(passed, turn)) };
                let beyond = if is_hidden && S::EPSILON >= f64::EPSILON { 0.0 } else { beyond };
                return (root, Event::Condition, Some((turn, beyond)));
            }
            let corrected = by_path(root);
            let (rate, curvature) = both(&slopes, corrected.value());
            // Where g is flat its roundings hide the place: it may be the end of the stage, and may not.
            let rounding = rounding_of(&series, corrected.value());
            if S::EPSILON >= f64::EPSILON && rounding > FLAT * rate.abs() * corrected.value() {
                return (corrected, Event::Condition, Some((corrected.value(), 0.0)));
            }
            let (place, beyond) = if side * curvature > 0.0 {
                // The parabola through the root goes so far beyond it.
                (corrected.value(), 0.5 * rate * rate / curvature.abs())
            } else {
                (corrected.value(), f64::INFINITY)
            };
            return (corrected, Event::Condition, Some((place, beyond)));
        }
        let nearest = turn.into_iter().chain([span]).map(|s| (s, -side * both(&series, s).0));
        (s, event, nearest.max_by(|a, b| a.1.total_cmp(&b.1)))
    }

    /// Notes whether the error bound leaves open if g vanishes, where it goes `beyond` zero or stays so far from it.
    fn doubt(&self, course: &mut Course<'_, S>, at: State<S>, beyond: f64) {
        let Some((end, _)) = self.end else { return };
        let State { depth, velocity, .. } = at.values();
        let lost = course.error_bound.sqrt() * course.problem.impact_speed.value();
        let error = if velocity > lost { 0.5 * lost * lost / velocity } else { lost };
        let (_, _, by_velocity) = end.gradient(depth, velocity.max(0.0));
        let allowed = by_velocity.abs() * error + end.noise(depth, velocity.max(0.0));
        course.is_in_doubt |= beyond.abs() <= allowed;
    }

    /// The first root of a switch on a step, and the switches that have one there: none where the step must end before a root whose place
    /// is not known. A switch that is not `shown` by its series keeps its side.
    fn first_kinks(&self, path: &Path<S, K>, shown: &[bool]) -> Option<(f64, Kinks)> {
        let switches = self.bound.switches();
        if switches.is_empty() {
            return None;
        }
        let span = path.span;
        // Before a root whose place is not known.
        let mut unknown = f64::INFINITY;
        // Where V falls all along, the ends of the step hold x and V between them.
        let ranges = matches!(path.form, Form::Velocity(_)).then(|| {
            let (from, to) = (path.at(S::zero()).values(), path.at(S::from_f64(span)).values());
            self.bound.ranges((from.depth, to.depth), (to.velocity, from.velocity))
        });
        let may_vanish = |register: usize| {
            ranges.as_ref().is_none_or(|ranges| {
                let (least, most) = ranges[register];
                !(least > 0.0 || most < 0.0)
            })
        };
        let switches = switches.iter().enumerate().filter(|(side, register)| shown[*side] && may_vanish(**register));
        let roots = switches.filter_map(|(side, register)| {
            // At its root, what is left of it over s.
            let first = usize::from(self.kinks.contains(&side));
            let mut series = [S::zero(); K];
            series[..K - first].copy_from_slice(&self.jets.register(*register)[first..K]);
            let (mut root, _) = first_fall(&series, series[0].value().signum(), span);
            if first == 0 {
                // The force may have a series that goes on where that of the switch has ended.
                let before = -series[0].value().signum();
                let passed = |s: f64| {
                    let at = path.at(S::from_f64(s));
                    let value = self.bound.switch_values(at.depth, at.velocity)[side].value();
                    (before * value, before * both(&series, s).1)
                };
                let located = root.and_then(|root| settled(passed, root));
                let located = located.or_else(|| (passed(span).0 > 0.0).then(|| root_before(passed, span)));
                if let (None, Some(near)) = (located, root)
                    && !(passed(near).0.abs() <= FLAT * series[0].value().abs())
                {
                    // Somewhere here: a shorter step tells.
                    unknown = unknown.min(SHORTENING * near);
                    return None;
                }
                root = located.or(root);
            }
            // A root at the end of the step is passed by the next.
            root.filter(|root| *root < span).map(|root| (side, root))
        });
        let roots: SmallVec<[(usize, f64); 4]> = roots.collect();
        first_of(&roots).filter(|(root, _)| *root <= unknown).or((unknown < span).then(|| (unknown, Kinks::new())))
    }

    /// Whether a step by velocity takes so much of it that no other is asked for.
    fn is_enough(&self, path: &Path<S, K>, limit: S) -> bool {
        let enough = if self.goes_by_velocity { STILL_ENOUGH } else { ENOUGH };
        path.form.share(path.span) >= enough && !self.may_end_over_depth(path, limit)
    }

    /// Whether a step by velocity gets to the limit, where a step over depth may end on it.
    fn may_end_over_depth(&self, path: &Path<S, K>, limit: S) -> bool {
        self.variable == Variable::Depth
            && limit.value() < f64::INFINITY
            && both(&path.depth, path.span).0 >= limit.value()
    }

    /// The series over time or depth, in a unit in which it has finite coefficients.
    ///
    /// The first one, over time, may be `made` already.
    fn over_time_or_depth(
        &mut self,
        course: &Course<'_, S>,
        force: S,
        limit: S,
        mut made: Option<Path<S, K>>,
    ) -> Solved<Path<S, K>> {
        let start = course.state;
        let mut unit = time_unit(start, force, self.mass, limit);
        if self.variable == Variable::Depth {
            unit = power_of_two_below(unit * start.velocity.value());
        }
        for _ in 0..RESCALED_MAX {
            let path = match self.variable {
                Variable::Time => made.take().unwrap_or_else(|| self.over_time(start, unit, K)),
                Variable::Depth => self.over_depth(start, unit),
            };
            if path.is_finite() {
                let mut path = path.spanned(self.tolerance);
                if let Form::Depth(unit) = path.form {
                    path.span = path.span.min((limit - start.depth).value() / unit);
                }
                return Ok(path);
            }
            unit *= 1.0 / 1_048_576.0;
        }
        Err(self.no_force(course, start))
    }

    /// The first `count` coefficients over time in units of `unit` (s).
    fn over_time(&mut self, start: State<S>, unit: f64, count: usize) -> Path<S, K> {
        self.jets.start(self.bound, &self.sides);
        let Self { bound, jets, .. } = self;
        Path::over_time(start, self.mass, Form::Time(unit), S::from_f64(unit), count, |x, v| jets.push(bound, x, v))
    }

    /// The series over depth in units of `unit` (m).
    fn over_depth(&mut self, start: State<S>, unit: f64) -> Path<S, K> {
        self.jets.start(self.bound, &self.sides);
        let Self { bound, jets, .. } = self;
        Path::over_depth(start, self.mass, unit, |x, v| jets.push(bound, x, v))
    }

    /// Whether a step under this force may go by velocity: over time, of a law with a branch point at rest.
    fn may_go_by_velocity(&self, force: S) -> bool {
        force.value() > 0.0 && !(self.variable == Variable::Time && self.falling.fall == Fall::Power(1))
    }

    /// The series over velocity, for a force that resists; the one `made` already, if there is one.
    fn over_velocity(&mut self, start: State<S>, force: S, made: Option<Path<S, K>>) -> Option<Path<S, K>> {
        if !self.may_go_by_velocity(force) {
            return None;
        }
        let fall = self.falling.fall;
        let path = made.unwrap_or_else(|| {
            self.jets.start_falling(self.bound, &self.sides, &self.falling);
            let Self { bound, jets, .. } = self;
            Path::over_velocity(start, self.mass, fall, |x, v| jets.push(bound, x, v))
        });
        self.spanned_by_velocity(path, start)
    }

    /// The longest such step.
    fn spanned_by_velocity(&self, path: Path<S, K>, start: State<S>) -> Option<Path<S, K>> {
        if !path.is_finite() {
            return None;
        }
        let fall = self.falling.fall;
        let mut path = path.spanned(self.tolerance);
        let is_little =
            path.depth[1].value() <= LITTLE * start.depth.value() && path.time[1].value() <= LITTLE * path.before;
        let goes_to_rest = fall != Fall::Exponential && path.span > VANISHING_SPAN;
        if goes_to_rest && !is_little && self.law.force(start.depth, S::zero()).value() == 0.0 {
            path.span = VANISHING_SPAN;
        }
        Some(path)
    }

    /// Adds the error of one step to the error bound of `W/V0²`, and the growth of what is there (docs/theory.md, section 10):
    ///
    /// ```text
    /// d(dW)/dt = -(F_V/M) dW      at one depth
    /// ```
    ///
    /// so that only a force that falls with V lets an error grow; of a force of the velocity alone it is an error of depth, which
    /// stays as it is: dW changes as F does. What a step adds is its roundings and what it has `left_out`. The force at its end is what comes back.
    fn widen_bound(
        &self,
        course: &mut Course<'_, S>,
        here: Local<S>,
        (start, next): (State<S>, State<S>),
        left_out: f64,
    ) -> Local<S> {
        let (a, b) = (start.values(), next.values());
        let (time, distance) = (b.time - a.time, b.depth - a.depth);
        let reached = self.local(next);
        let mass = self.mass.value();
        let grown = if self.is_of_velocity {
            (reached.force.value() / here.force.value()).abs()
        } else {
            (time * here.fall.min(reached.fall).abs() / mass).exp()
        };
        let fastest = a.velocity.max(b.velocity);
        let end_force = reached.force.value().abs();
        let largest = here.force.value().abs().max(if end_force.is_finite() { end_force } else { 0.0 }) / mass;
        let relative = 1.0 / course.problem.impact_speed.value();
        let rounding = 6.0 * fastest * fastest + 3.0 * largest * (b.depth + 2.0 * distance);
        // What a step by shares of V leaves out counts beside the depth reached.
        let cut = fastest * fastest + if self.falling.fall == Fall::Exponential { largest * b.depth } else { 0.0 };
        let added = S::EPSILON.max(f64::EPSILON) * rounding + 2.0 * left_out * cut;
        let grown = if grown.is_finite() { grown } else { 1.0 };
        course.error_bound = course.error_bound * grown + relative * relative * added;
        reached
    }
}

/// A unit of time (s), a power of two: the shortest of that in which the force stops the projectile and that to the limit.
fn time_unit<S: Scalar>(start: State<S>, force: S, mass: S, limit: S) -> f64 {
    let speed = start.velocity.value();
    let stopping = speed * mass.value() / force.value().abs();
    let crossing = (limit.value() - start.depth.value()) / speed;
    let shortest = stopping.min(crossing);
    power_of_two_below(if shortest.is_finite() && shortest > 0.0 { shortest } else { 1.0 })
}

/// The first of the roots of switches, and the switches that have one there.
fn first_of(roots: &[(usize, f64)]) -> Option<(f64, Kinks)> {
    let first = roots.iter().map(|(_, root)| *root).reduce(f64::min)?;
    // Of two at one place neither may be found again just behind it, for ever.
    let at_first = roots.iter().filter(|(_, root)| *root <= first * (1.0 + SAME_PLACE));
    Some((first, at_first.map(|(side, _)| *side).collect()))
}

/// Where the step ends, and how: at the first rest, at the limit if that comes before, else at its span.
fn first_event<S: Scalar, const K: usize>(path: &Path<S, K>, limit: S) -> Ending<S> {
    let span = path.span;
    if let Some(end) = path.limit_over_depth(limit) {
        return (end, Event::Limit);
    }
    let rest = match path.form {
        Form::Time(_) => first_fall(&path.velocity, 1.0, span).0,
        Form::Velocity(Fall::Power(_)) => (span >= 1.0).then_some(1.0),
        Form::Depth(_) | Form::Velocity(Fall::Exponential) => None,
    };
    let end = rest.unwrap_or(span);
    let beyond = |s: S| value(&path.depth, s) - limit;
    let is_open = !matches!(path.form, Form::Depth(_)) && limit.value() < f64::INFINITY;
    if is_open && beyond(S::from_f64(end)).value() >= 0.0 {
        let limit = limit.value();
        let passed = |s| {
            let (depth, speed) = both(&path.depth, s);
            (depth - limit, speed)
        };
        let root = S::from_f64(root_before(passed, end));
        return (corrected(root, end, beyond, |s| slope(&path.depth, s)), Event::Limit);
    }
    match (rest, path.form) {
        (Some(rest), Form::Time(_)) => {
            let at = |s| value(&path.velocity, s);
            (corrected(S::from_f64(rest), span, at, |s| slope(&path.velocity, s)), Event::Rest)
        }
        (Some(rest), Form::Depth(_) | Form::Velocity(_)) => (S::from_f64(rest), Event::Rest),
        (None, _) if path.speed_left() <= 0.0 => (S::from_f64(span), Event::Rest),
        (None, _) => (S::from_f64(span), Event::None),
    }
}

/// `root`, which is that of the values, corrected in the number type; as it is where two roots meet.
fn corrected<S: Scalar>(root: S, end: f64, function: impl Fn(S) -> S, slope: impl Fn(S) -> S) -> S {
    let mut s = root;
    for _ in 0..CORRECTIONS {
        let next = s - function(s).over(slope(s));
        if !((next.value() - root.value()).abs() <= 1e-6 * end) {
            break;
        }
        let is_last = S::EPSILON >= f64::EPSILON || next.value() == s.value();
        s = next;
        if is_last {
            break;
        }
    }
    s
}

/// The least velocity inside the step, where V falls before it and rises behind it.
fn least_inside<S: Scalar, const K: usize>(path: &Path<S, K>, end: f64) -> Option<f64> {
    let rate = |s: f64| slope(&path.velocity, S::from_f64(s)).value();
    if matches!(path.form, Form::Velocity(_)) || !(rate(0.0) < 0.0 && rate(end) > 0.0) {
        return None;
    }
    let mut slopes = [0.0; K];
    for k in 1..K {
        slopes[k - 1] = k as f64 * path.velocity[k].value();
    }
    let place = root_before(|s| both(&slopes, s), end);
    Some(path.at(S::from_f64(place)).velocity.value())
}
