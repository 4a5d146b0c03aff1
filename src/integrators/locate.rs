//! Where on one step does the projectile come to rest, and where does it pass the next boundary?
//!
//! What an event is belongs to [`crate::physics::problem`]; here it is found on the polynomials of a step. No answer
//! rests on signs at the ends of a step alone, unless a proof says that they suffice. The proofs, for a step inside
//! one stage `M V' = -(p + s x + r V + q V²)` with `r, q >= 0`, starting at `V > 0`; `s >= 0` in 3 and 4:
//!
//! 1. `x` grows strictly while `V > 0`. So the first root of `V` decides: a boundary is reached on the flight exactly
//!    when it lies at or before the depth of rest, and then once.
//! 2. `s = 0`: the equation of V is autonomous, so V is strictly monotone or constant. It has at most one root, and
//!    `V(h) > 0` proves `V > 0` on the whole of `[0, h]`.
//! 3. `q = 0`: the equation is linear. Roots of V are at least `pi/w` apart, `w² = s/M` (damping moves them further
//!    apart; the overdamped V has one root at most). On a step with `w h < pi` the sign of `V(h)` therefore decides
//!    as in 2. The step rule ensures `w h <= 1.8`.
//! 4. Otherwise (`s > 0` and `q > 0`) nothing is assumed: [`first_root`] isolates the earliest root of V on the whole
//!    step by Bernstein coefficients, roots of even multiplicity included.
//! 5. `s < 0`, which has `r = q = 0`: `V = A e^(l t) + B e^(-l t)`, `l² = -s/M`, has one root at most, where
//!    `e^(2 l t) = -B/A`. The sign of `V(h)` therefore decides as in 2, however long the step, and V stays negative behind
//!    its root.
//!
//! Inside a stage V has no minimum above zero: where `V' = 0`, `M V'' = -s V <= 0` for `s >= 0`; for `s < 0` the force
//! keeps its sign up to the end of the stage, so V is monotone.
//!
//! `rest` and `passage` then solve for the place. At a trial time the polynomial gives `x` and `V`, and the law
//! itself gives `V'`, `V''`, `V'''` at no further cost, so one trial is corrected to fourth order. Both corrections
//! are quadratic equations solved in the form that does not lose digits, `2 D/(v + sqrt(v² - 2 a D))`: they are exact
//! for a constant force, and near a double root (the boundary is just touched) they converge as fast as elsewhere.

#![expect(clippy::inline_always, reason = "measured: one flight is one function, 1.3 times faster than with calls")]

use crate::physics::{Scalar, Stage, State};

/// Trials allowed for one event. Four are usual; sixty halvings of a bracket exhaust a 53-bit number.
const TRIALS_MAX: usize = 80;

/// Halvings of a bracket: more than a number has digits.
const HALVINGS: u32 = 80;

/// Steps in which a root settles, and how far from its guess, relatively.
const SETTLING_MAX: u32 = 12;
const NEAR: f64 = 0.1;

/// How much of the way to a root may be lost in the roundings of the function.
const SETTLED: f64 = 1e-10;

/// What a search on one step found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Found<S> {
    /// The event, inside the step.
    Inside(State<S>),
    /// No event on the step; the state at its end.
    Beyond(State<S>),
    /// V vanishes on the step, and whether the boundary comes first must be asked from the place of rest.
    RestFirst,
}

/// First three derivatives of V at a point, by the law of the stage (mass one).
struct Jet<S> {
    first: S,
    second: S,
    third: S,
}

impl<S: Scalar> Jet<S> {
    /// ```text
    /// V' = -(p + s x + r V + q V²),  V'' = -(s V + g V'),  V''' = -(s V' + g V'' + 2 q V'²),  g = r + 2 q V
    /// ```
    #[inline(always)]
    fn at(law: &Stage<S>, point: &State<S>) -> Self {
        let v = point.velocity;
        let qv = law.drag * v;
        let gradient = law.viscosity + qv + qv;
        let first = -(law.static_force + law.stiffness * point.depth + (law.viscosity + qv) * v);
        let second = -(law.stiffness * v + gradient * first);
        let third = -(law.stiffness * first + gradient * second + (law.drag + law.drag) * first * first);
        Self { first, second, third }
    }
}

/// When a trial may be the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closing {
    /// Error allowed in V (at rest) or in x (at a boundary), in the units of the step.
    tolerance: f64,
    /// Longest last correction: derivatives beyond V''' enter its error with the fourth power.
    reach: f64,
}

impl Closing {
    pub(crate) fn new(tolerance: f64) -> Self {
        Self { tolerance, reach: tolerance.sqrt().sqrt() }
    }

    #[inline(always)]
    fn accepts<S: Scalar>(&self, correction: &Correction<S>) -> bool {
        correction.time.value().abs() <= self.reach && correction.error <= self.tolerance
    }
}

/// From a trial to the event.
struct Correction<S> {
    /// Time from the trial to the event.
    time: S,
    /// Estimate of what the solution of the cubic or quartic equation lacks, in V or in x.
    error: f64,
}

impl<S: Scalar> Correction<S> {
    /// A next trial and nothing more.
    fn guess(time: S) -> Self {
        Self { time, error: f64::INFINITY }
    }
}

/// Largest terms, relative to the step, for which an inverse series is used.
const SERIES_MAX: f64 = 0.02;

/// Time from `point` to rest, to fourth order.
///
/// Near rest by the inverse series of `V - A t + V'' t²/2 + V''' t³/6 = 0`, which costs one division:
///
/// ```text
/// t = e (1 + b + 2 b² + c + ...),   e = V/A,  b = V'' e/(2 A),  c = V''' e²/(6 A),  A = -V'
/// ```
///
/// Farther away, or where the series would be too short, from the quadratic in the form that loses no digits,
/// `2 V/(A + sqrt(A² - 2 V'' V))`, then its cubic term. Where the quadratic has no root, Newton's step if V falls,
/// else infinite.
#[inline(always)]
fn to_rest<S: Scalar>(jet: &Jet<S>, velocity: S, closing: &Closing) -> Correction<S> {
    let deceleration = -jet.first;
    let falls = deceleration.value() > 0.0;
    let inverse = S::one().over(deceleration);
    let newton = velocity * inverse;
    let bent = S::from_f64(0.5) * jet.second * inverse * newton;
    let cubic = jet.third * sixth() * inverse * newton * newton;
    let (b, c) = (bent.value().abs(), cubic.value().abs());
    if falls && b < SERIES_MAX && c < SERIES_MAX {
        let time = newton * (S::one() + bent + (bent * bent + bent * bent + cubic));
        // The next term is 5 b³ + 5 b c + (the quartic's own).
        let error = 6.0 * b * (b * b + c) * velocity.value().abs();
        if error <= closing.tolerance || time.value().abs() > closing.reach {
            return Correction { time, error };
        }
    }
    let product = jet.second * velocity;
    let discriminant = deceleration * deceleration - (product + product);
    if discriminant.value() <= 0.0 {
        return Correction::guess(if falls { newton } else { S::from_f64(f64::INFINITY) });
    }
    let slope = discriminant.sqrt();
    let denominator = deceleration + slope;
    if denominator.value() <= 0.0 {
        return Correction::guess(S::from_f64(f64::INFINITY));
    }
    let time = (velocity + velocity).over(denominator);
    let beyond = jet.third * time * time * time * sixth();
    let correction = beyond.over(slope);
    // Far away the cubic term says nothing; it may not move the trial by more than a quarter.
    let relative = correction.value().abs() / time.value().abs();
    if relative > 0.25 {
        return Correction::guess(time);
    }
    Correction { time: time + correction, error: 3.0 * relative * beyond.value().abs() }
}

/// `1/6` to the precision of the number.
#[inline(always)]
fn sixth<S: Scalar>() -> S {
    S::one().over(S::from_f64(6.0))
}

/// Place of rest on `(0, span]`, searched from `start`; V is known to have at most one root there.
///
/// `at` evaluates the step's polynomials. The last correction needs no further evaluation: the law gives the state
/// there, too.
#[inline(always)]
pub(crate) fn rest<S: Scalar>(
    law: &Stage<S>,
    at: impl Fn(f64) -> State<S>,
    start: State<S>,
    span: f64,
    closing: &Closing,
) -> Found<S> {
    let mut point = start;
    let (mut low, mut high, mut high_known) = (0.0, span, false);
    for _ in 0..TRIALS_MAX {
        let jet = Jet::at(law, &point);
        let correction = to_rest(&jet, point.velocity, closing);
        let step = correction.time;
        let here = point.time.value();
        if closing.accepts(&correction) && here + step.value() <= span {
            return Found::Inside(at_rest(&point, &jet, step));
        }
        let mut next = here + step.value();
        if !(next > low && next < high) {
            next = if high_known { 0.5 * (low + high) } else { span };
        }
        if next == here {
            return Found::Inside(at_rest(&point, &jet, step));
        }
        point = at(next);
        if point.velocity.value() > 0.0 {
            if next >= span {
                return Found::Beyond(point);
            }
            low = next;
        } else {
            high = next;
            high_known = true;
        }
    }
    // The bracket is one spacing wide by now: its newest end is the root.
    Found::Inside(State { velocity: S::zero(), ..point })
}

/// The state of rest, `step` after `point`.
#[inline(always)]
fn at_rest<S: Scalar>(point: &State<S>, jet: &Jet<S>, step: S) -> State<S> {
    let half = S::from_f64(0.5);
    let mean = point.velocity + step * (jet.first * half + step * jet.second * sixth());
    State { time: point.time + step, depth: point.depth + step * mean, velocity: S::zero() }
}

/// Time from `point` to the depth `law.end`, to fourth order; `None` where the parabola there does not reach it.
///
/// From `D = V t + V' t²/2 + V'' t³/6 + V''' t⁴/24`, near a simple passage by the inverse series, one division:
///
/// ```text
/// t = e (1 - b + (2 b² - c) - (5 b³ - 5 b c + d) + ...),  e = D/V,  b = V' e/(2 V),  c = V'' e²/(6 V),  d = V''' e³/(24 V)
/// ```
///
/// else from the quadratic, `t = 2 D/(V + sqrt(V² + 2 V' D))`, the root with V >= 0, then the higher terms.
#[inline(always)]
fn to_depth<S: Scalar>(law: &Stage<S>, jet: &Jet<S>, point: &State<S>, closing: &Closing) -> Option<Correction<S>> {
    let distance = law.end - point.depth;
    let v = point.velocity;
    let inverse = S::one().over(v);
    let newton = distance * inverse;
    let bent = S::from_f64(0.5) * jet.first * newton * inverse;
    let cubic = jet.second * sixth() * newton * newton * inverse;
    let (b, c) = (bent.value().abs(), cubic.value().abs());
    if v.value() > 0.0 && b < SERIES_MAX && c < SERIES_MAX {
        let quartic = jet.third * S::from_f64(1.0 / 24.0) * newton * newton * newton * inverse;
        let square = bent * bent + bent * bent - cubic;
        let cube = S::from_f64(5.0) * bent * (bent * bent - cubic) + quartic;
        let time = newton * (S::one() - bent + square - cube);
        // The next term is 14 b⁴ - 21 b² c + 3 c² + 6 b d - (the quintic's own).
        let error = 21.0 * (b * b + c) * (b * b + c) * distance.value().abs();
        if error <= closing.tolerance || time.value().abs() > closing.reach {
            return Some(Correction { time, error });
        }
    }
    let product = jet.first * distance;
    let energy = v * v + (product + product);
    if energy.value() < 0.0 {
        return None;
    }
    let arrival = energy.sqrt();
    let denominator = v + arrival;
    if denominator.value() <= 0.0 {
        // At rest, and on the boundary if the distance is zero.
        return Some(if distance.value() == 0.0 {
            Correction { time: S::zero(), error: 0.0 }
        } else {
            Correction::guess(S::zero())
        });
    }
    let time = (distance + distance).over(denominator);
    let beyond = time * time * time * sixth() * (jet.second + S::from_f64(0.25) * time * jet.third);
    let slope = arrival + S::from_f64(0.5) * jet.second * time * time;
    // Far away the higher terms say nothing; they may not move the trial by more than a quarter.
    let relative = beyond.value().abs() / (time.value() * slope.value()).abs();
    if relative <= 0.25 && slope.value() > 0.0 {
        Some(Correction { time: time - beyond.over(slope), error: 3.0 * relative * beyond.value().abs() })
    } else {
        Some(Correction::guess(time))
    }
}

/// Where the depth `law.end` is passed on `(0, span]`, searched from `start` with V > 0 up to there.
///
/// `reached` says that the boundary lies at or before `span`, which then is the place of rest or a place beyond the
/// boundary; the search then always ends `Inside`. Else it gives up with `RestFirst` at the first sign of a rest.
#[inline(always)]
pub(crate) fn passage<S: Scalar>(
    law: &Stage<S>,
    at: impl Fn(f64) -> State<S>,
    start: State<S>,
    span: f64,
    reached: bool,
    closing: &Closing,
) -> Found<S> {
    let mut point = start;
    let (mut low, mut high, mut high_known) = (0.0, span, reached);
    for _ in 0..TRIALS_MAX {
        let jet = Jet::at(law, &point);
        let correction = match to_depth(law, &jet, &point, closing) {
            Some(correction) => correction,
            None if !reached => return Found::RestFirst,
            // Out of reach for this parabola only: its vertex comes nearest.
            None => Correction::guess(-point.velocity / jet.first),
        };
        let step = correction.time;
        let here = point.time.value();
        if closing.accepts(&correction) && here + step.value() <= span {
            return Found::Inside(at_depth(law, &point, &jet, step));
        }
        let mut next = here + step.value();
        if !(next > low && next < high) {
            next = if high_known { 0.5 * (low + high) } else { span };
        }
        if next == here {
            return Found::Inside(at_depth(law, &point, &jet, S::zero()));
        }
        point = at(next);
        if point.velocity.value() > 0.0 && point.depth.value() < law.end.value() {
            if next >= span {
                return Found::Beyond(point);
            }
            low = next;
        } else if point.velocity.value() > 0.0 || reached {
            high = next;
            high_known = true;
        } else {
            return Found::RestFirst;
        }
    }
    let jet = Jet::at(law, &point);
    Found::Inside(at_depth(law, &point, &jet, S::zero()))
}

/// The state at the boundary, `step` after `point`: its depth is the boundary's own, its velocity not negative.
#[inline(always)]
fn at_depth<S: Scalar>(law: &Stage<S>, point: &State<S>, jet: &Jet<S>, step: S) -> State<S> {
    let half = S::from_f64(0.5);
    let velocity = point.velocity + step * (jet.first + step * (jet.second * half + step * jet.third * sixth()));
    let velocity = if velocity.value() > 0.0 { velocity } else { S::zero() };
    State { time: point.time + step, depth: law.end, velocity }
}

/// The place before `end` where a function, which rises there from below zero to above it, vanishes: by Newton's method, by
/// halving where that leaves the bracket. `function` gives value and slope.
pub(super) fn root_before(function: impl Fn(f64) -> (f64, f64), end: f64) -> f64 {
    let (mut low, mut high, mut at) = (0.0, end, end);
    for _ in 0..HALVINGS {
        let (value, slope) = function(at);
        if value < 0.0 {
            low = at;
        } else {
            high = at;
        }
        let newton = at - value / slope;
        // Before the bracket is asked: what rounding put just outside of it is no reason to halve.
        if (newton - at).abs() <= 2.0 * f64::EPSILON * at {
            break;
        }
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next <= low || next >= high {
            break;
        }
        at = next;
    }
    at
}

/// The root near `guess`, by Newton's method with `function` for value and slope; `None` where it does not settle near by.
pub(super) fn settled(function: impl Fn(f64) -> (f64, f64), guess: f64) -> Option<f64> {
    let (mut at, mut change) = (guess, f64::INFINITY);
    for _ in 0..SETTLING_MAX {
        let (value, slope) = function(at);
        let next = at - value / slope;
        if !((next - guess).abs() <= NEAR * guess) {
            return None;
        }
        change = (next - at).abs();
        at = next;
        if change <= 4.0 * f64::EPSILON * guess {
            break;
        }
    }
    (change <= SETTLED * guess).then_some(at)
}

/// Whether the polynomial `c[0] + c[1] t + ...` is negative on the whole of `[0, span]`, as its Bernstein coefficients show:
/// `false` says nothing.
///
/// # Panics
/// As [`first_root`].
pub(crate) fn is_negative(coefficients: &[f64], span: f64) -> bool {
    let mut bernstein = [0.0; COEFFICIENTS_MAX];
    let bernstein = &mut bernstein[..coefficients.len()];
    let size = to_bernstein(coefficients, span, bernstein);
    let noise = 4.0 * coefficients.len() as f64 * f64::EPSILON * size;
    bernstein.iter().all(|b| *b < -noise)
}

/// Highest number of coefficients that [`first_root`] takes.
pub const COEFFICIENTS_MAX: usize = 64;

/// Earliest root of the polynomial `c[0] + c[1] t + ...` in `(0, span]`, roots of even multiplicity included.
///
/// On `[a, b]` the polynomial lies in the convex hull of its Bernstein coefficients, and has at most as many roots as
/// they have changes of sign, of the same parity (Descartes). The step is walked from the left in boxes that are
/// halved until the coefficients have one sign (no root) or one change of it (exactly one root, then bisected). A box
/// whose values cannot be distinguished from zero within their rounding error holds a root, too: that is how a touching root is
/// found, and how a pair closer than rounding can separate counts as one. A root at `t = 0` itself is not reported:
/// leading coefficients that are exactly zero are divided out first.
///
/// With `e` a few rounding units of the sum of `|c[k]| span^k`, and `p = g (t - root)^m` nearby, the error of a root is
/// about `(e/g)^(1/m)`.
///
/// # Panics
/// If there are more than [`COEFFICIENTS_MAX`] coefficients, or `span` is not positive and finite.
pub fn first_root(coefficients: &[f64], span: f64) -> Option<f64> {
    assert!(span > 0.0 && span.is_finite(), "span {span} is not positive and finite");
    let count = coefficients.len();
    assert!(count <= COEFFICIENTS_MAX, "{count} coefficients, at most {COEFFICIENTS_MAX} fit");
    let skipped = coefficients.iter().take_while(|c| **c == 0.0).count();
    let coefficients = &coefficients[skipped..];
    let n = coefficients.len().checked_sub(1)?;

    let mut whole = [0.0; COEFFICIENTS_MAX];
    let whole = &mut whole[..=n];
    let size = to_bernstein(coefficients, span, whole);
    // De Casteljau and the conversion each take n additions of numbers not above `size`.
    let noise = 4.0 * (n as f64 + 1.0) * f64::EPSILON * size;

    let mut room = [0.0; COEFFICIENTS_MAX];
    let (mut left, mut width) = (0.0, 1.0);
    // Each box is halved at most WIDTH_BITS times, and at most n boxes of one width hold a change of sign.
    for _ in 0..COEFFICIENTS_MAX * WIDTH_BITS {
        let part = &mut room[..=n];
        restrict(whole, left, left + width, part);
        if part.iter().all(|b| *b > noise) || part.iter().all(|b| *b < -noise) {
            left += width;
            if left >= 1.0 {
                return None;
            }
            // Boxes stay aligned to their width, so the next may be as wide as its place allows.
            while width < 0.5 && (left / (2.0 * width)).fract() == 0.0 {
                width *= 2.0;
            }
            continue;
        }
        let one_root = part[0].abs() > noise && part[n].abs() > noise && changes(part) == 1;
        if one_root {
            return Some(span * bisect(whole, left, left + width));
        }
        if width <= TOUCH_WIDTH || part.iter().all(|b| b.abs() <= noise) {
            // A simple root on the corner of boxes of any width ends here, too, and is the corner itself.
            let is_corner = part[n].abs() <= noise && part[0].abs() > noise;
            return Some(span * (left + if is_corner { width } else { 0.5 * width }));
        }
        width *= 0.5;
    }
    None
}

/// Halvings before a box that still has no verdict counts as a touching root.
const WIDTH_BITS: usize = 40;
/// `2^-40`, far below the width `sqrt(noise)` in which a double root cannot be distinguished from its neighbourhood.
const TOUCH_WIDTH: f64 = 1.0 / (1_u64 << WIDTH_BITS) as f64;

/// Bernstein coefficients on `[0, span]`, `b_i = sum over k <= i of C(i,k)/C(n,k) c_k span^k`; returns the sum of
/// `|c_k| span^k`, which bounds them.
fn to_bernstein(coefficients: &[f64], span: f64, bernstein: &mut [f64]) -> f64 {
    let n = coefficients.len() - 1;
    let mut power = 1.0;
    let mut size = 0.0;
    for (k, c) in coefficients.iter().enumerate() {
        bernstein[k] = c * power;
        size += bernstein[k].abs();
        power *= span;
    }
    // Dividing by C(n,k) first, the rest is the binomial sum, which n rounds of additions perform.
    let mut binomial = 1.0;
    for (k, b) in bernstein.iter_mut().enumerate() {
        *b /= binomial;
        binomial *= (n - k) as f64 / (k as f64 + 1.0);
    }
    for round in 1..=n {
        for i in (round..=n).rev() {
            bernstein[i] += bernstein[i - 1];
        }
    }
    size
}

/// Bernstein coefficients on `[from, to]` of the polynomial whose coefficients on `[0, 1]` are `whole`.
fn restrict(whole: &[f64], from: f64, to: f64, part: &mut [f64]) {
    part.copy_from_slice(whole);
    let n = whole.len() - 1;
    // Left part [0, to]: de Casteljau from the back has b_0 of every round.
    if to < 1.0 {
        for round in 1..=n {
            for i in (round..=n).rev() {
                part[i] = (1.0 - to) * part[i - 1] + to * part[i];
            }
        }
    }
    // Right part [from/to, 1] of that.
    if from > 0.0 {
        let ratio = from / to;
        for round in 1..=n {
            for i in 0..=n - round {
                part[i] = (1.0 - ratio) * part[i] + ratio * part[i + 1];
            }
        }
    }
}

/// Changes of sign in a sequence, zeros left out. Signs themselves are compared: the product of two numbers below 1e-162
/// is zero.
fn changes(sequence: &[f64]) -> usize {
    let signs = sequence.iter().filter(|value| **value != 0.0).map(|value| value.is_sign_negative());
    signs.clone().zip(signs.skip(1)).filter(|(last, next)| last != next).count()
}

/// The one change of sign in `[from, to]`, by halving down to neighbouring numbers.
fn bisect(whole: &[f64], mut from: f64, mut to: f64) -> f64 {
    let value = |t: f64| {
        let mut room = [0.0; COEFFICIENTS_MAX];
        let part = &mut room[..whole.len()];
        restrict(whole, 0.0, t, part);
        part[whole.len() - 1]
    };
    let rising = value(to) > 0.0;
    for _ in 0..64 {
        let middle = 0.5 * (from + to);
        if middle <= from || middle >= to {
            break;
        }
        if (value(middle) > 0.0) == rising { to = middle } else { from = middle }
    }
    to
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test may stop at the first surprise")]
mod tests;
