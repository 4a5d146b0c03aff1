//! A force `p(x) + q(x) V²` that resists: over depth the equation is linear in W = V², and all of it is integrals over depth.
//!
//! ```text
//! dW/dx = -2 (p + q W)/M:   W(x) = (W0 - integral of 2 p/M e^B dx) e^(-B),   B(x) = integral of 2 q/M dx,   t = integral of dx/V
//! ```
//!
//! **Through a stretch** of the length D, `x = x0 + D u`. **To rest** at the distance L, `x = x0 + L u (2-u)`: from rest backwards,
//! with `b(u)` for the B that is left, nothing cancels, and `V/(1-u)` and dt/du are smooth:
//!
//! ```text
//! W(u) = e^b * integral from u to 1 of 2 p/M e^(-b) dx,   dx = 2 L (1-u) du
//! ```
//!
//! L is where W(0) = W0: by Newton's method, dW(0)/dL = 2 p(x0+L)/M e^b(0).
//!
//! Integrals up to each of the 24 nodes of [`GAUSS`] are those of the polynomial through them, of degree 23; the time by the rule is
//! exact to degree 47. Three other places show whether the polynomials hold, and a bound of p and q on a disc around the stretch that
//! nothing hides between them (docs/theory.md, section 10).

use std::sync::LazyLock;

use super::gauss::{GAUSS, NODES};
use super::locate::root_before;
use crate::physics::expression::{Bound, Disc};
use crate::physics::{Scalar, State};

/// Other places at which the polynomials are asked.
const ASKED: [f64; 3] = [0.0, 0.5, 0.98];

/// All places: the nodes, those asked, and the end.
pub(super) const PLACES: usize = NODES + ASKED.len() + 1;
const START: usize = NODES;
const END: usize = PLACES - 1;

/// Radius of the disc on which p and q must have a bound, over half of a stretch: an error of the polynomials falls as 4.3^-24 then.
const DISC: f64 = 2.25;

/// What the polynomials may lack of the force, over the greatest, and of the pace dt/du, of whose integral they lack the square.
const LACKING_OF_FORCE: f64 = 1e-14;
const LACKING_OF_PACE: f64 = 1e-10;
const LACKING_OF_INTEGRAL: f64 = 100.0;

/// Lengths that are tried, and the share of a stretch, or of the way to rest, that is tried where its polynomials do not hold.
const TRIED: u32 = 4;
const SHORTENING: f64 = 0.6;

/// Share of the first length tried below which a series is as good.
const LEAST: f64 = 1e-3;

/// How much longer than the one before a stretch may be.
const GROWTH: f64 = 4.0;

/// Halvings until a stretch has a bound, and what is tried to be longer then.
const BOUNDED_IN: u32 = 12;
const LONGER: [f64; 2] = [1.4, 1.2];

/// First length of a stretch, over the distance to rest under the forces at its start and in its middle.
const AHEAD: f64 = 1.3;

/// Secants to the root of W on a stretch.
const SECANTS: u32 = 8;

/// Corrections of the distance to rest, the relative one that is the last, and the one that roundings may come to.
const CORRECTIONS: u32 = 6;
const LAST: f64 = 4e-15;
const ROUNDED: f64 = 1e-13;

/// Rows for all places, of what each node weighs: `of_node[j][i]` for the value at place i.
type Rows = [[f64; PLACES]; NODES];

/// What the polynomial through the nodes integrates to.
struct Tables {
    places: [f64; PLACES],
    /// From the start up to each place.
    up_to: Rows,
    /// From each place to the end, times `1-u`, over `(1-u)²` of that place.
    to_rest: Rows,
    /// The value of the polynomial at each of [`ASKED`].
    asked: [[f64; NODES]; ASKED.len()],
}

static TABLES: LazyLock<Box<Tables>> = LazyLock::new(|| {
    let others = ASKED.into_iter().chain([1.0]);
    let mut all = GAUSS.nodes.into_iter().chain(others);
    let places: [f64; PLACES] = std::array::from_fn(|_| all.next().unwrap_or(1.0));
    let (mut up_to, mut to_rest) = ([[0.0; PLACES]; NODES], [[0.0; PLACES]; NODES]);
    for (i, place) in places.into_iter().enumerate() {
        for (share, weight) in GAUSS.nodes.into_iter().zip(GAUSS.weights) {
            let (before, behind) = (GAUSS.at(place * share), GAUSS.at(place + (1.0 - place) * share));
            for j in 0..NODES {
                up_to[j][i] += place * weight * before[j];
                to_rest[j][i] += weight * (1.0 - share) * behind[j];
            }
        }
    }
    Box::new(Tables { places, up_to, to_rest, asked: ASKED.map(|at| GAUSS.at(at)) })
});

/// The rows times the values at the nodes.
fn times<S: Scalar>(rows: &Rows, values: impl Fn(usize) -> S) -> [S; PLACES] {
    let mut sums = [S::zero(); PLACES];
    for (j, of_node) in rows.iter().enumerate() {
        let value = values(j);
        for (sum, weight) in sums.iter_mut().zip(of_node) {
            *sum += value * S::from_f64(*weight);
        }
    }
    sums
}

/// What the polynomial through the nodes lacks at the places asked.
fn lacking<S: Scalar>(values: &[S; PLACES]) -> f64 {
    let lacks = TABLES.asked.iter().enumerate().map(|(place, weights)| {
        let polynomial: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value.value()).sum();
        (polynomial - values[NODES + place].value()).abs()
    });
    lacks.fold(0.0, f64::max)
}

/// The largest size among values.
fn largest<S: Scalar>(values: &[S; PLACES]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.value().abs()))
}

/// p and q at the places of a stretch.
struct Forces<S> {
    p: [S; PLACES],
    q: [S; PLACES],
    /// Whether q changes with x.
    q_varies: bool,
}

impl<S: Scalar> Forces<S> {
    /// What the polynomials lack, over the greatest force at the energies up to `most` (V², m²/s²), beyond roundings; `None` if it is
    /// too much. The integrand is p times an exponential.
    fn lacking(&self, integrand: &[S; PLACES], most: f64) -> Option<f64> {
        let of_drag = if self.q_varies { lacking(&self.q) * most } else { 0.0 };
        let scale = largest(integrand) + largest(&self.q) * most;
        let lacks = (lacking(integrand) + of_drag) / scale;
        (lacks <= LACKING_OF_FORCE).then(|| (lacks - 8.0 * f64::EPSILON).max(0.0))
    }
}

/// A stretch at its places: the force, p times the exponential under the integral, and W (m²/s²).
struct Passed<S> {
    forces: Forces<S>,
    integrand: [S; PLACES],
    energies: [S; PLACES],
}

/// A force of this kind, ahead of a state.
#[derive(Clone, Copy)]
pub(super) struct Ahead<'l, S> {
    /// p, and q beside it.
    pub(super) parts: &'l Bound<S>,
    pub(super) mass: S,
    pub(super) start: State<S>,
}

/// The solution on a stretch.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'l, S> {
    ahead: Ahead<'l, S>,
    pub(super) way: Way<S>,
    /// The state at its end, the time since its start.
    pub(super) end: State<S>,
    /// What it leaves out, relative to the velocity.
    pub(super) left_out: f64,
    pub(super) evaluations: usize,
    /// How long the next one may be (m).
    pub(super) next: f64,
}

/// How a stretch ends: at a distance (m) from its start.
#[derive(Clone, Copy)]
pub(super) enum Way<S> {
    Through(S),
    ToLimit(S),
    ToRest(S),
}

impl<'l, S: Scalar> Ahead<'l, S> {
    /// A stretch whose places show the force, up to `limit` (m); the one before knows how long it may be (m).
    pub(super) fn stretch(self, limit: S, longest: Option<f64>) -> Option<Stretch<'l, S>> {
        let x = self.start.depth;
        let longest = longest.unwrap_or_else(|| AHEAD * self.stopping_distance());
        let mut far = (limit.value() - x.value()).min(longest);
        let mut evaluations = 0;
        let least = LEAST * far;
        for _ in 0..TRIED {
            far = self.bounded(far).filter(|far| *far >= least)?;
            let distance = if x.value() + far >= limit.value() { limit - x } else { S::from_f64(far) };
            let passed = self.energies(distance);
            evaluations += PLACES;
            let rest = first_rest(&passed.energies).map(|share| share * far);
            let found = match rest {
                Some(distance) => self.to_rest(distance, &mut evaluations),
                None => self.through(distance, limit, &passed),
            };
            if let Some(found) = found {
                return Some(Stretch { evaluations, ..found });
            }
            far = SHORTENING * rest.unwrap_or(far);
        }
        None
    }

    /// p and q (values) at a depth.
    fn at(self, x: f64) -> (f64, f64) {
        let registers = self.parts.along(([S::from_f64(x)], [S::zero()]), None);
        (self.parts.result_of(&registers)[0].value(), self.parts.beside_of(&registers)[0].value())
    }

    /// Distance (m) to rest, roughly.
    fn stopping_distance(self) -> f64 {
        let x = self.start.depth.value();
        let energy = self.start.velocity.value() * self.start.velocity.value();
        let under = |at: f64| stopping_distance(self.mass.value(), energy, self.at(at));
        let first = under(x);
        first.max(under(x + 0.5 * first))
    }

    /// The longest stretch, `far` (m) at most, around which p and q have a bound.
    fn bounded(self, mut far: f64) -> Option<f64> {
        let x = self.start.depth.value();
        let energy = self.start.velocity.value() * self.start.velocity.value();
        let is_bounded = |far: f64| {
            let [p, q] = self.parts.discs_of_both(Disc::new(x + 0.5 * far, DISC * 0.5 * far));
            let seen = p.centre.abs() + q.centre.abs() * energy;
            p.shows(seen) && q.size() * energy <= Disc::HIDDEN_MAX * seen
        };
        let mut halvings = 0..BOUNDED_IN;
        while !is_bounded(far) {
            halvings.next()?;
            far *= 0.5;
        }
        if halvings.start > 0 {
            for longer in LONGER {
                far = if is_bounded(longer * far) { longer * far } else { far };
            }
        }
        (far > 0.0 && far.is_finite()).then_some(far)
    }

    /// p and q at depths.
    fn forces(self, depths: [S; PLACES]) -> Forces<S> {
        let registers = self.parts.along((depths, [S::zero(); PLACES]), None);
        let (p, q) = (self.parts.result_of(&registers), self.parts.beside_of(&registers));
        Forces { p, q, q_varies: matches!(self.parts.beside(), Some(Ok(_))) }
    }

    /// W (m²/s²) at the places of a stretch of this length (m).
    fn energies(self, distance: S) -> Passed<S> {
        let forces = self.forces(TABLES.places.map(|u| self.start.depth + distance * S::from_f64(u)));
        let rate = (distance + distance).over(self.mass);
        let spent = if forces.q_varies {
            times(&TABLES.up_to, |j| forces.q[j] * rate)
        } else {
            TABLES.places.map(|u| forces.q[START] * rate * S::from_f64(u))
        };
        let growth = spent.map(S::exp);
        let integrand: [S; PLACES] = std::array::from_fn(|i| forces.p[i] * growth[i]);
        let lost = times(&TABLES.up_to, |j| integrand[j] * rate);
        let energy = self.start.velocity * self.start.velocity;
        let energies = std::array::from_fn(|i| (energy - lost[i]).over(growth[i]));
        Passed { forces, integrand, energies }
    }

    /// The solution through a stretch.
    fn through(self, distance: S, limit: S, passed: &Passed<S>) -> Option<Stretch<'l, S>> {
        let Passed { forces, integrand, energies, .. } = passed;
        let lacks = forces.lacking(integrand, energies[START].value())?;
        let resists =
            (0..PLACES).all(|i| (forces.p[i] + forces.q[i] * energies[i]).value() > 0.0 && energies[i].value() > 0.0);
        if !resists {
            return None;
        }
        let pace = energies.map(|energy| distance.over(energy.sqrt()));
        let of_pace = lacking(&pace) / largest(&pace);
        if !(of_pace <= LACKING_OF_PACE) {
            return None;
        }
        let end = State { time: integral(&pace), depth: self.start.depth + distance, velocity: energies[END].sqrt() };
        let is_limit = end.depth.value() >= limit.value();
        let way = if is_limit { Way::ToLimit(distance) } else { Way::Through(distance) };
        Some(self.solved(way, end, (forces, lacks, of_pace)))
    }

    /// The stretch with what it leaves out.
    fn solved(self, way: Way<S>, end: State<S>, (forces, lacks, of_pace): (&Forces<S>, f64, f64)) -> Stretch<'l, S> {
        let energy = self.start.velocity.value() * self.start.velocity.value();
        let force = largest(&forces.p) + largest(&forces.q) * energy;
        let distance = (end.depth - self.start.depth).value();
        let of_velocity = lacks * force * distance / (self.mass.value() * energy);
        let at_end = (forces.p[END].value(), forces.q[END].value());
        let speed = end.velocity.value();
        let next = (AHEAD * stopping_distance(self.mass.value(), speed * speed, at_end)).min(GROWTH * distance);
        Stretch {
            ahead: self,
            way,
            end,
            left_out: of_velocity + LACKING_OF_INTEGRAL * of_pace * of_pace,
            evaluations: 0,
            next,
        }
    }

    /// The solution to rest, about `distance` (m) ahead.
    fn to_rest(self, distance: f64, evaluations: &mut usize) -> Option<Stretch<'l, S>> {
        let energy = self.start.velocity * self.start.velocity;
        let mut distance = S::from_f64(distance);
        for trial in 0..CORRECTIONS {
            let (passed, growth, pace) = self.before_rest(self.start.depth + distance, distance);
            let Passed { forces, integrand, energies } = &passed;
            *evaluations += PLACES;
            let slope = (forces.p[END] + forces.p[END]).over(self.mass) * growth;
            let correction = (energies[START] - energy).over(slope);
            let next = distance - correction;
            if !(slope.value() > 0.0 && next.value() > 0.0) {
                return None;
            }
            let relative = (correction.value() / next.value()).abs();
            // Of dual numbers the first gives the distance only.
            let is_first = trial == 0 && !(energy.is_constant() && slope.is_constant());
            if !is_first && (relative <= LAST || trial > 1 && relative <= ROUNDED) {
                let lacks = forces.lacking(integrand, energy.value())?;
                let resists = (0..END).all(|i| (forces.p[i] + forces.q[i] * energies[i]).value() > 0.0);
                let of_pace = lacking(&pace) / largest(&pace);
                if !(resists && of_pace <= LACKING_OF_PACE) {
                    return None;
                }
                let end = State { time: integral(&pace), depth: self.start.depth + next, velocity: S::zero() };
                return Some(self.solved(Way::ToRest(next), end, (forces, lacks, of_pace)));
            }
            distance = next;
        }
        None
    }

    /// On the last `distance` (m) before `rest` (m), with e^b at its start, and dt/du (s).
    fn before_rest(self, rest: S, distance: S) -> (Passed<S>, S, [S; PLACES]) {
        let left = TABLES.places.map(|u| S::from_f64((1.0 - u) * (1.0 - u)));
        let forces = self.forces(left.map(|left| rest - distance * left));
        let twice = distance + distance;
        let rate = (twice + twice).over(self.mass);
        let behind = if forces.q_varies {
            times(&TABLES.to_rest, |j| forces.q[j] * rate)
        } else {
            [forces.q[START] * rate * S::from_f64(0.5); PLACES]
        };
        let growth: [S; PLACES] = std::array::from_fn(|i| (left[i] * behind[i]).exp());
        let integrand: [S; PLACES] = std::array::from_fn(|i| forces.p[i].over(growth[i]));
        let gained = times(&TABLES.to_rest, |j| integrand[j] * rate);
        // W over (1-u)².
        let quotients: [S; PLACES] = std::array::from_fn(|i| growth[i] * gained[i]);
        let energies = std::array::from_fn(|i| left[i] * quotients[i]);
        let pace = quotients.map(|quotient| twice.over(quotient.sqrt()));
        (Passed { forces, integrand, energies }, growth[START], pace)
    }
}

/// The share of a stretch at which W falls to zero, if it does: on the polynomial through its values.
fn first_rest<S: Scalar>(energies: &[S; PLACES]) -> Option<f64> {
    let values = energies.map(Scalar::value);
    let nodes = || TABLES.places[..NODES].iter().chain([&1.0]).zip(values[..NODES].iter().chain([&values[END]]));
    let (high, at_high) = nodes().find(|(_, energy)| **energy <= 0.0)?;
    let before = nodes().take_while(|(place, _)| *place < high).last();
    let (low, at_low) = before.unwrap_or((&0.0, &values[START]));
    let value = |at: f64| GAUSS.at(at).iter().zip(&values).map(|(weight, energy)| weight * energy).sum::<f64>();
    // Between two nodes it is as good as a line: secants.
    let ((mut one, mut at_one), (mut other, mut at_other)) = ((*low, *at_low), (*high, *at_high));
    for _ in 0..SECANTS {
        let next = other - (other - one) * at_other / (at_other - at_one);
        if !(next > 0.0 && next <= 1.0) {
            return Some(other);
        }
        (one, at_one, other, at_other) = (other, at_other, next, value(next));
        if at_other.abs() <= 4.0 * f64::EPSILON * values[START] || at_other == at_one {
            break;
        }
    }
    Some(other)
}

/// Distance (m) in which constant p and q take all of W (m²/s²).
fn stopping_distance(mass: f64, energy: f64, (p, q): (f64, f64)) -> f64 {
    if p > 0.0 && q > 0.0 { 0.5 * mass / q * (q * energy / p).ln_1p() } else { 0.5 * mass * energy / (p + q * energy) }
}

/// The integral by the rule.
fn integral<S: Scalar>(values: &[S; PLACES]) -> S {
    values.iter().zip(GAUSS.weights).fold(S::zero(), |sum, (value, weight)| sum + *value * S::from_f64(weight))
}

impl<S: Scalar> Stretch<'_, S> {
    /// The state at the share `s` of the way, its time since the start.
    pub(super) fn at(&self, s: S) -> State<S> {
        if s.value() >= 1.0 {
            return self.end;
        }
        match self.way {
            Way::Through(distance) | Way::ToLimit(distance) => {
                let Passed { energies, .. } = self.ahead.energies(distance * s);
                let pace = energies.map(|energy| (distance * s).over(energy.sqrt()));
                State {
                    time: integral(&pace),
                    depth: self.ahead.start.depth + distance * s,
                    velocity: energies[END].sqrt(),
                }
            }
            // What is left is a way of the same kind.
            Way::ToRest(distance) => {
                let left = distance * (S::one() - s) * (S::one() - s);
                let (Passed { energies, .. }, _, pace) = self.ahead.before_rest(self.end.depth, left);
                State {
                    time: self.end.time - integral(&pace),
                    depth: self.end.depth - left,
                    velocity: energies[START].sqrt(),
                }
            }
        }
    }

    /// The share of the way before `end` at which so much time (s) has passed `since` the start.
    pub(super) fn moment(&self, since: f64, end: f64) -> f64 {
        let passed = |s: f64| {
            let at = self.at(S::from_f64(s));
            let speed = at.velocity.value();
            let pace = match self.way {
                Way::Through(distance) | Way::ToLimit(distance) => distance.value() / speed,
                Way::ToRest(distance) => 2.0 * distance.value() * (1.0 - s) / speed,
            };
            (at.time.value() - since, pace)
        };
        root_before(passed, end)
    }
}
