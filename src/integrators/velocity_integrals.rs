//! A force that depends on the velocity alone: depth and time are integrals over the velocity.
//!
//! ```text
//! V = V0 (1-s)^m or V0 e^(-s):   t = integral of -M V'(s)/F(V) ds,   x = x0 + integral of V dt
//! ```
//!
//! The rule of Gauss and Legendre takes both from the force at [`NODES`] places of the step, and each step of the expression serves
//! all of them. It is exact for polynomials of degree 47: where the pace dt/ds is a polynomial of degree 23 to ten digits, as three
//! other places show, its integral has all of them (docs/theory.md, section 10).

use std::sync::{Arc, LazyLock};

use super::gauss::{GAUSS, NODES};
use super::locate::{root_before, settled};
use crate::physics::expression::{Bound, Fall, Falling};
use crate::physics::{Scalar, State};

/// Other places at which the pace is asked, as shares of the step. The force at rest may have no quotient: it is asked close to there.
const ASKED: [f64; 3] = [0.0, 0.5, 0.98];

/// All places in order: the start, the nodes with the two others among them, and the end.
pub(super) const PLACES: usize = NODES + ASKED.len() + 1;

/// What the polynomial may lack of the pace at the places asked, over the greatest pace.
const LACKING_MAX: f64 = 1e-10;

/// What the integral lacks over the square of that.
const LACKING_OF_INTEGRAL: f64 = 100.0;

/// The places of a step in order, as shares of it.
struct Rule {
    share: [f64; PLACES],
    /// Weight of each in the integral.
    weight: [f64; PLACES],
    /// The place of each of [`ASKED`].
    asked: [usize; ASKED.len()],
    /// What each place weighs in the polynomial at each of [`ASKED`].
    weights: [[f64; ASKED.len() + 1]; PLACES],
}

static RULE: LazyLock<Rule> = LazyLock::new(|| {
    let of_rule = (0..NODES).map(|node| (GAUSS.nodes[node], GAUSS.weights[node], Some(node)));
    let others = ASKED.into_iter().chain([1.0]).map(|share| (share, 0.0, None));
    let mut places: Vec<(f64, f64, Option<usize>)> = of_rule.chain(others).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let asked = ASKED.map(|at| places.iter().position(|(share, ..)| *share == at).unwrap_or(0));
    let of_nodes = ASKED.map(|at| GAUSS.at(at));
    let weight = |place: usize, which: usize| match (places[place].2, of_nodes.get(which)) {
        (Some(node), Some(of_nodes)) => of_nodes[node],
        _ => 0.0,
    };
    Rule {
        share: std::array::from_fn(|place| places[place].0),
        weight: std::array::from_fn(|place| places[place].1),
        asked,
        weights: std::array::from_fn(|place| std::array::from_fn(|which| weight(place, which))),
    }
});

/// A step of a law of velocity over the fall of V.
pub(super) struct Integrals<'l, S> {
    bound: &'l Bound<S>,
    mass: S,
    pub(super) start: State<S>,
    falling: Arc<Falling>,
}

/// The force at the places of a step.
pub(super) struct Forces<S> {
    span: S,
    /// All registers of the expression.
    pub(super) registers: Vec<[S; PLACES]>,
    pub(super) force: [S; PLACES],
    /// dt/ds (s).
    pace: [S; PLACES],
}

impl<'l, S: Scalar> Integrals<'l, S> {
    pub(super) fn new(bound: &'l Bound<S>, mass: S, start: State<S>, falling: Arc<Falling>) -> Self {
        Self { bound, mass, start, falling }
    }

    /// The velocity (m/s) at `s`.
    pub(super) fn velocity(&self, s: S) -> S {
        self.start.velocity * self.falling.fall.left(s)
    }

    /// -dV/ds (m/s) at `s`.
    pub(super) fn fall_rate(&self, s: f64) -> f64 {
        self.start.velocity.value() * self.falling.fall.slope(s)
    }

    /// The force at the places of a step of the length `span`.
    pub(super) fn forces(&self, span: S) -> Forces<S> {
        let places: [S; PLACES] = std::array::from_fn(|place| span * S::from_f64(RULE.share[place]));
        let mut velocity = self.falling.fall.left_along(&places);
        for left in &mut velocity {
            *left = self.start.velocity * *left;
        }
        let ways = ([self.start.depth; PLACES], velocity);
        let registers = self.bound.along(ways, Some((&self.falling, &places)));
        let force = self.bound.result_of(&registers);
        // -M dV/ds, which is M V where V falls by shares.
        let momentum = self.mass * self.start.velocity;
        let rate: [S; PLACES] = match self.falling.fall {
            Fall::Exponential => std::array::from_fn(|place| self.mass * registers[1][place]),
            Fall::Power(m) => {
                let left = Fall::Power(m.saturating_sub(1)).left_along(&places);
                let m = S::from_f64(f64::from(m));
                std::array::from_fn(|place| momentum * (m * left[place]))
            }
        };
        let pace = std::array::from_fn(|place| rate[place].over(force[place]));
        Forces { span, registers, force, pace }
    }

    /// The state at the end of such a step, its time since the start of the step.
    pub(super) fn end(&self, forces: &Forces<S>) -> State<S> {
        let (mut time, mut distance) = (S::zero(), S::zero());
        // Not at the very end, where the pace need not be a number.
        let places = forces.registers[1].iter().zip(&forces.pace).zip(RULE.weight).take(PLACES - 1);
        for ((velocity, pace), weight) in places {
            let part = *pace * S::from_f64(weight);
            time += part;
            distance += part * *velocity;
        }
        let (time, distance) = (time * forces.span, distance * forces.span);
        State { time, depth: self.start.depth + distance, velocity: self.velocity(forces.span) }
    }

    /// The state at `s`, its time since the start of the step.
    pub(super) fn at(&self, s: S) -> State<S> {
        self.end(&self.forces(s))
    }

    /// dt/ds (s) at `s`.
    pub(super) fn pace(&self, s: S) -> S {
        let force = self.bound.eval(self.start.depth, self.velocity(s));
        (self.mass * self.start.velocity * self.falling.fall.slope(s)).over(force)
    }

    /// Where the depth is `limit` on a step that `ends` at `span` behind it.
    pub(super) fn passage(&self, limit: S, ends: State<S>, span: f64) -> S {
        // As under a constant force.
        let share = ((limit - self.start.depth).over(ends.depth - self.start.depth)).value();
        let (from, to) = (self.start.velocity.value(), ends.velocity.value());
        let left = (from * from + (to * to - from * from) * share).sqrt() / from;
        let guess = match self.falling.fall {
            Fall::Power(m) => 1.0 - left.powf(1.0 / f64::from(m)),
            Fall::Exponential => -left.ln(),
        };
        let beyond = |s: S| {
            let at = self.at(s);
            (at.depth - limit, at.velocity * self.pace(s))
        };
        let values = |s: f64| {
            let (value, slope) = beyond(S::from_f64(s));
            (value.value(), slope.value())
        };
        let root = settled(values, guess).filter(|root| *root <= span).unwrap_or_else(|| root_before(values, span));
        let root = S::from_f64(root);
        let (value, slope) = beyond(root);
        root - value.over(slope)
    }

    /// Where the time since the start is `since` (s), before `end`.
    pub(super) fn moment(&self, since: f64, end: f64) -> f64 {
        let passed = |s: f64| {
            let s = S::from_f64(s);
            (self.at(s).time.value() - since, self.pace(s).value())
        };
        root_before(passed, end)
    }
}

impl<S: Scalar> Forces<S> {
    /// The value of a register at the start.
    pub(super) fn at_start(&self, register: usize) -> f64 {
        self.registers[register][0].value()
    }

    /// The greatest size of a register, or of the force, at the places.
    pub(super) fn largest(values: &[S; PLACES]) -> f64 {
        let sizes = values.iter().map(|value| value.value().abs());
        sizes.filter(|size| size.is_finite()).fold(0.0, f64::max)
    }

    /// What the integrals lack, relatively; `None` where the places show too little, or where the force does not resist all along.
    pub(super) fn lacking(&self) -> Option<f64> {
        // Not at the very end, where the pace need not be a number.
        let pace: [f64; PLACES - 1] = std::array::from_fn(|place| self.pace[place].value());
        let resists = pace.iter().all(|pace| *pace >= 0.0 && pace.is_finite());
        let largest = pace.iter().copied().fold(0.0, f64::max);
        // A fourth sum beside the three fills the vector.
        let mut polynomial = [0.0; ASKED.len() + 1];
        for (weights, pace) in RULE.weights.iter().zip(&pace) {
            polynomial.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * pace);
        }
        let lacking = RULE.asked.iter().zip(polynomial).map(|(place, value)| (value - pace[*place]).abs() / largest);
        let lacking = lacking.fold(0.0, f64::max);
        (resists && largest > 0.0 && lacking <= LACKING_MAX).then_some(LACKING_OF_INTEGRAL * lacking * lacking)
    }

    /// Whether the places show that the switch in `register` keeps its side, which begins or ends at a root of it or not.
    pub(super) fn keeps(&self, register: usize, is_above: bool, from_root: bool, to_root: bool) -> bool {
        let side = if is_above { 1.0 } else { -1.0 };
        let values = self.registers[register].map(|value| side * value.value());
        let first = usize::from(from_root || values[0] == 0.0);
        let values = &values[first..PLACES - usize::from(to_root)];
        let mut has_fallen = false;
        let changes = values.windows(2).map(|pair| pair[1] - pair[0]);
        // Where it comes nearest to zero it may touch it between two places.
        let turns = changes.fold(false, |turns, change| {
            let turns = turns || has_fallen && change > 0.0;
            has_fallen |= change < 0.0;
            turns
        });
        // At the very end it may be zero: the step goes no further.
        !turns
            && values.iter().rev().enumerate().all(|(from_end, value)| *value > 0.0 || from_end == 0 && *value == 0.0)
    }
}
