//! Ends of stages that are no places: a speed, or any zero of a function g(x, V).
//!
//! ```text
//! end_velocity = v   g = V - v,            met where g <= 0
//! until = "a = b"    g = a(x, V) - b(x, V)  met where g = 0 or changes its sign, in either direction
//! a plug             g = R(x) - F(x, V),   met where g <= 0 (super::plug)
//! ```
//!
//! A stage that is entered where its condition is met ends there. Touching counts. An end at a depth may stand beside a
//! condition: the stage ends at whichever comes first.

use smallvec::SmallVec;

use super::expression::{Bound, Known, Tape};
use super::problem::State;
use super::scalar::Scalar;
use super::units::Dimension;
use std::sync::LazyLock;

/// Where a stage ends besides a depth.
#[derive(Clone, Debug)]
pub struct Condition<S = f64> {
    /// g in values.
    values: Bound,
    parameters: Vec<S>,
    kind: Kind,
    /// Index of the stage behind it.
    next: usize,
}

/// What kind of an end it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A speed, from above; of a piece of a table also from below.
    Speed,
    /// A zero of g, from either side.
    Zero,
    /// A zero of g from above, where a plug breaks off.
    Plug,
}

impl<S: PartialEq> PartialEq for Condition<S> {
    fn eq(&self, other: &Self) -> bool {
        let is_same = self.kind == other.kind && self.next == other.next;
        is_same && self.parameters == other.parameters && self.values.tape() == other.values.tape()
    }
}

impl<S: Scalar> Condition<S> {
    fn new(tape: &Tape, parameters: Vec<S>, kind: Kind, next: usize) -> Self {
        let values: Vec<_> = parameters.iter().map(|parameter| parameter.value()).collect();
        Self { values: tape.bind(&values), parameters, kind, next }
    }

    /// V = `speed` (m/s), with stage `next` behind it.
    pub(crate) fn of_speed(speed: S, next: usize) -> Self {
        static TAPE: LazyLock<Option<Tape>> = LazyLock::new(|| {
            Tape::read_equation("V = v", &[Known { name: "v", value: 0.0, unit: Dimension::Velocity.into() }]).ok()
        });
        match &*TAPE {
            Some(tape) => Self::new(tape, vec![speed], Kind::Speed, next),
            None => unreachable!("the text of an end at a speed is an equation"),
        }
    }

    /// V = `speed` (m/s) from below.
    pub(super) fn of_rise(speed: S) -> Self {
        static TAPE: LazyLock<Option<Tape>> = LazyLock::new(|| {
            Tape::read_equation("v = V", &[Known { name: "v", value: 0.0, unit: Dimension::Velocity.into() }]).ok()
        });
        match &*TAPE {
            Some(tape) => Self::new(tape, vec![speed], Kind::Speed, 0),
            None => unreachable!("the text of an end at a speed is an equation"),
        }
    }

    /// The speed (m/s) at which it ends a stage.
    pub(crate) fn speed(&self) -> Option<S> {
        if self.kind == Kind::Speed { self.parameters.first().copied() } else { None }
    }

    /// The zero of the equation `tape` at `parameters` (SI units), with stage `next` behind it.
    pub(crate) fn of_zero(tape: &Tape, parameters: Vec<S>, next: usize) -> Self {
        Self::new(tape, parameters, Kind::Zero, next)
    }

    /// Whether both have the same function.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let values = |condition: &Self| condition.parameters.iter().map(|p| p.value()).collect::<Vec<_>>();
        self.kind == other.kind && self.values.tape() == other.values.tape() && values(self) == values(other)
    }

    /// As [`Condition::of_zero`] from above, where a plug breaks off.
    pub(super) fn of_plug(tape: &Tape, parameters: Vec<S>, next: usize) -> Self {
        Self::new(tape, parameters, Kind::Plug, next)
    }

    /// Index of the stage behind it.
    pub fn next(&self) -> usize {
        self.next
    }

    /// Whether a plug breaks off there.
    pub fn is_plug(&self) -> bool {
        self.kind == Kind::Plug
    }

    /// Whether g may have either sign before its zero.
    pub(crate) fn has_two_sides(&self) -> bool {
        self.kind == Kind::Zero
    }

    /// g with its parameters in this number type.
    pub(crate) fn bound(&self) -> Bound<S> {
        self.values.tape().bind(&self.parameters)
    }

    /// Whether it is a speed.
    pub fn is_speed(&self) -> bool {
        self.kind == Kind::Speed
    }

    pub(crate) fn tape(&self) -> &Tape {
        self.values.tape()
    }

    pub(crate) fn parameters(&self) -> &[S] {
        &self.parameters
    }

    /// g at depth `x` (m) and velocity `v` (m/s).
    pub fn value(&self, x: f64, v: f64) -> f64 {
        self.values.eval(x, v)
    }

    /// g, dg/dx and dg/dV.
    pub(crate) fn gradient(&self, x: f64, v: f64) -> (f64, f64, f64) {
        self.values.gradient(x, v)
    }

    /// Rounding of g there: of its two sides, and of x and V.
    pub(crate) fn noise(&self, x: f64, v: f64) -> f64 {
        let (_, by_depth, by_velocity) = self.values.gradient(x, v);
        let place = (by_depth * x).abs() + (by_velocity * v).abs();
        let (left, right) = self.values.sides_of_equation(x, v);
        8.0 * f64::EPSILON * (left.abs() + right.abs() + if place.is_finite() { place } else { 0.0 })
    }

    /// Whether g is zero at a state, up to rounding; of a speed or a plug, whether it is no longer above zero.
    pub(crate) fn is_met(&self, at: State<S>) -> bool {
        let State { depth, velocity, .. } = at.values();
        let (g, noise) = (self.value(depth, velocity), self.noise(depth, velocity));
        if self.kind == Kind::Zero { g.abs() <= noise } else { g <= noise }
    }

    /// The sign of g before its zero, for a stage that is entered at a state.
    pub(crate) fn side(&self, at: State<S>) -> f64 {
        let State { depth, velocity, .. } = at.values();
        if self.kind == Kind::Zero { self.value(depth, velocity).signum() } else { 1.0 }
    }

    /// `state` with what the end fixes exactly.
    pub(crate) fn at_end(&self, state: State<S>) -> State<S> {
        match (self.kind, self.parameters.first()) {
            (Kind::Speed, Some(speed)) => State { velocity: *speed, ..state },
            _ => state,
        }
    }

    /// Whether g may be zero for x and V between these.
    pub(crate) fn may_vanish(&self, x: (f64, f64), v: (f64, f64)) -> bool {
        let (least, most) = self.values.range(x, v);
        !(least > 0.0 || most < 0.0)
    }

    /// What a path shows of g, which is above zero on `side` where it begins. `place` gives depth (m) and velocity (m/s) at a share
    /// of the path from 0 to 1.
    ///
    /// A part is looked at in halves until bounds exclude a zero, or until g is shown by its values.
    ///
    /// # Errors
    /// What `place` says.
    pub(crate) fn look<E>(&self, side: f64, mut place: impl FnMut(f64) -> Result<(f64, f64), E>) -> Result<Sight, E> {
        let mut parts: SmallVec<[_; LEVELS as usize + 2]> = SmallVec::new();
        let mut looked = 0;
        parts.push(((0.0, place(0.0)?), (1.0, place(1.0)?), 0));
        while let Some((from, to, level)) = parts.pop() {
            let share = 0.5 * (from.0 + to.0);
            let middle = (share, place(share)?);
            let (x, v) = (span([from.1.0, middle.1.0, to.1.0]), span([from.1.1, middle.1.1, to.1.1]));
            if !self.may_vanish(x, v) {
                continue;
            }
            let width = self.width(x, v);
            if self.is_shown(x, v) || (level >= LEVELS && !width.is_finite()) {
                if side * self.value(to.1.0, to.1.1) <= 0.0 {
                    return Ok(Sight::Crossed(from.0, to.0));
                }
                looked += 1;
                // Two zeros may lie in it, as close as bounds can tell.
                if looked > LOOKED_MAX || !(width > self.noise(x.1, v.1)) || level >= DEEPEST {
                    continue;
                }
            } else if level >= LEVELS {
                return Ok(Sight::Hidden(from.0, to.0));
            }
            parts.extend([(middle, to, level + 1), (from, middle, level + 1)]);
        }
        Ok(Sight::Clear)
    }

    /// Whether the values at its corners show g in a box: no more lies between its bounds, and the bounds of quarters add up to
    /// those of the whole, so that g does not turn in it.
    fn is_shown(&self, x: (f64, f64), v: (f64, f64)) -> bool {
        let width = self.width(x, v);
        let corners = [(x.0, v.0), (x.0, v.1), (x.1, v.0), (x.1, v.1)];
        let (least, most) = span(corners.map(|(x, v)| self.value(x, v)));
        let noise = self.noise(x.1, v.1);
        let part = |(from, to): (f64, f64), i: u32| {
            let at = |i: u32| from + (to - from) * 0.25 * f64::from(i);
            (at(i), at(i + 1))
        };
        let quarters = (0..4).map(|i| self.width(part(x, i), part(v, i))).sum::<f64>();
        width <= VISIBLE * (most - least) + noise && quarters <= ADDITIVE * width + noise
    }

    /// How far the bounds of g lie apart.
    fn width(&self, x: (f64, f64), v: (f64, f64)) -> f64 {
        let (least, most) = self.values.range(x, v);
        most - least
    }

    /// The first depth between two (m) at which it is met at rest, by a search at 33 places.
    pub(crate) fn met_at_rest(&self, from: f64, to: f64) -> Option<f64> {
        let g = |x: f64| self.value(x, 0.0);
        let side = if self.kind == Kind::Zero { g(from).signum() } else { 1.0 };
        if side * g(from) <= 0.0 {
            return Some(from);
        }
        let place = |panel: u32| from + (to - from) * f64::from(panel) / f64::from(PANELS);
        let panel = (1..=PANELS).find(|panel| side * g(place(*panel)) <= 0.0)?;
        let (mut low, mut high) = (place(panel - 1), place(panel));
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if side * g(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// The same condition in another number type, parameters taken over by value.
    pub fn cast<T: Scalar>(&self) -> Condition<T> {
        let parameters = self.parameters.iter().map(|p| T::from_f64(p.value())).collect();
        Condition { values: self.values.clone(), parameters, kind: self.kind, next: self.next }
    }

    /// Why g has no value at depth `x` (m) and velocity `v` (m/s).
    pub(crate) fn explain(&self, x: f64, v: f64) -> Option<String> {
        let reason = self.values.explain(x, v).or_else(|| self.values.explain_series(x, v))?;
        Some(format!("in {}, {}", reason.term, reason.reason))
    }
}

/// What a path shows of a condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Sight {
    /// Its sign does not change.
    Clear,
    /// Its sign changes first between these shares of the path.
    Crossed(f64, f64),
    /// Between these shares of the path bounds leave room for zeros that the values do not show.
    Hidden(f64, f64),
}

/// The least and the greatest.
fn span<const N: usize>(numbers: [f64; N]) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    numbers.into_iter().fold(ends, |(least, most), number| (least.min(number), most.max(number)))
}

/// Halvings of a path that is looked at, where the values do not show g; where they do and its zeros may be close; and how many
/// such parts of a path are halved.
const LEVELS: u32 = 10;
const DEEPEST: u32 = 50;
const LOOKED_MAX: u32 = 1000;

/// How much wider than the values at its corners the bounds of a box may be, and those of its quarters together than its own: a
/// term that comes twice widens both alike, and a function that turns many times fills each quarter.
const VISIBLE: f64 = 4.0;
const ADDITIVE: f64 = 1.5;

/// Parts in which a stretch is searched.
const PANELS: u32 = 32;
