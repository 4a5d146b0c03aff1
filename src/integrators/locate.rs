//! Where on one step does the projectile come to rest, and where does it pass the next boundary?
//!
//! What an event is belongs to [`crate::physics::event`]; here it is found on the polynomials of a step. No answer
//! rests on signs at the ends of a step alone, unless a proof says that they suffice. The proofs, for a step inside
//! one stage `M V' = -(p + s x + r V + q V²)` with `s, r, q >= 0`, starting at `V > 0`:
//!
//! 1. `x` grows strictly while `V > 0`. So the first root of `V` decides: a boundary is reached on the flight exactly
//!    when it lies at or before the depth of rest, and then once.
//! 2. `s = 0`: the equation of V is autonomous, so V is strictly monotone or constant. It has at most one root, and
//!    `V(h) > 0` proves `V > 0` on the whole of `[0, h]`.
//! 3. `q = 0`: the equation is linear. Roots of V are at least `pi/w` apart, `w² = s/M` (damping moves them further
//!    apart; the overdamped V has one root at most). On a step with `w h < pi` the sign of `V(h)` therefore decides
//!    as in 2. The step rule keeps `w h <= 1.8`.
//! 4. Otherwise (`s > 0` and `q > 0`) nothing is assumed: [`first_root`] isolates the earliest root of V on the whole
//!    step by Bernstein coefficients, roots of even multiplicity included.
//!
//! Inside a stage V has no minimum above zero: where `V' = 0`, `M V'' = -s V <= 0`.
//!
//! `rest` and `passage` then solve for the place. At a trial time the polynomial gives `x` and `V`, and the law
//! itself gives `V'`, `V''`, `V'''` at no further cost, so one trial is corrected to fourth order. Both corrections
//! are quadratic equations solved in the form that does not lose digits, `2 D/(v + sqrt(v² - 2 a D))`: they are exact
//! for a constant force, and near a double root (the boundary is just touched) they converge as fast as elsewhere.

#![expect(clippy::inline_always, reason = "measured: one flight is one function, 1.3 times faster than with calls")]

use crate::physics::{Scalar, Stage, State};

/// Trials allowed for one event. Four are usual; sixty halvings of a bracket exhaust a 53-bit number.
const TRIALS_MAX: usize = 80;

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
/// Farther away, or where the series would be too short, from the quadratic in the form that keeps its digits,
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
    let mean = point.velocity + step * (jet.first * fault!("rest-depth", half, S::one()) + step * jet.second * sixth());
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
    let way = law.end - point.depth;
    let v = point.velocity;
    let inverse = S::one().over(v);
    let newton = way * inverse;
    let bent = S::from_f64(0.5) * jet.first * newton * inverse;
    let cubic = jet.second * sixth() * newton * newton * inverse;
    let (b, c) = (bent.value().abs(), cubic.value().abs());
    if v.value() > 0.0 && b < SERIES_MAX && c < SERIES_MAX {
        let quartic = jet.third * S::from_f64(1.0 / 24.0) * newton * newton * newton * inverse;
        let square = bent * bent + bent * bent - cubic;
        let cube = S::from_f64(5.0) * bent * (bent * bent - cubic) + quartic;
        let time = newton * (S::one() - bent + square - cube);
        // The next term is 14 b⁴ - 21 b² c + 3 c² + 6 b d - (the quintic's own).
        let error = 21.0 * (b * b + c) * (b * b + c) * way.value().abs();
        if error <= closing.tolerance || time.value().abs() > closing.reach {
            return Some(Correction { time, error });
        }
    }
    let product = jet.first * way;
    let energy = v * v + (product + product);
    if energy.value() < 0.0 {
        return None;
    }
    let arrival = energy.sqrt();
    let denominator = v + arrival;
    if denominator.value() <= 0.0 {
        // At rest, and on the boundary if the way is nothing.
        return Some(if way.value() == 0.0 {
            Correction { time: S::zero(), error: 0.0 }
        } else {
            Correction::guess(S::zero())
        });
    }
    let time = (way + way).over(denominator);
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
    let velocity = point.velocity
        + step
            * (jet.first
                + step * (jet.second * fault!("passage-velocity", half, S::one()) + step * jet.third * sixth()));
    let velocity = if velocity.value() > 0.0 { velocity } else { S::zero() };
    State { time: point.time + step, depth: law.end, velocity }
}

/// Highest number of coefficients that [`first_root`] takes.
pub const COEFFICIENTS_MAX: usize = 64;

/// Earliest root of the polynomial `c[0] + c[1] t + ...` in `(0, span]`, roots of even multiplicity included.
///
/// On `[a, b]` the polynomial lies in the convex hull of its Bernstein coefficients, and has at most as many roots as
/// they have changes of sign, of the same parity (Descartes). The step is walked from the left in boxes that are
/// halved until the coefficients have one sign (no root) or one change of it (exactly one root, then bisected). A box
/// whose values cannot be told from zero by their rounding error holds a root, too: that is how a touching root is
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
/// `2^-40`, far below the width `sqrt(noise)` in which a double root cannot be told from its neighbourhood.
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
    // Left part [0, to]: de Casteljau from the back keeps b_0 of every round.
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
mod tests {
    use super::super::taylor::Series;
    use super::*;
    use proptest::prelude::*;

    /// Coefficients of the product of `(t - root)` and of `((t - a)² + b²)`. Dyadic numbers: exact.
    fn product(roots: &[f64], pairs: &[(f64, f64)]) -> Vec<f64> {
        let mut polynomial = vec![1.0];
        let mut times = |factor: &[f64]| {
            let mut next = vec![0.0; polynomial.len() + factor.len() - 1];
            for (i, a) in polynomial.iter().enumerate() {
                for (j, b) in factor.iter().enumerate() {
                    next[i + j] += a * b;
                }
            }
            polynomial = next;
        };
        for root in roots {
            times(&[-root, 1.0]);
        }
        for (a, b) in pairs {
            times(&[a * a + b * b, -2.0 * a, 1.0]);
        }
        polynomial
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// Roots and pairs are eighths, so the coefficients are exact and the roots are known with certainty.
        #[test]
        fn first_root_is_the_least_of_the_known_roots(
            roots in prop::collection::vec(-16_i32..48, 0..5),
            pairs in prop::collection::vec((-16_i32..48, 1_i32..16), 0..3),
            span in 1_i32..40,
        ) {
            let roots: Vec<f64> = roots.into_iter().map(|r| f64::from(r) / 8.0).collect();
            let pairs: Vec<(f64, f64)> =
                pairs.into_iter().map(|(a, b)| (f64::from(a) / 8.0, f64::from(b) / 8.0)).collect();
            // An end of the span between two eighths: a root on the very end is a test of its own.
            let span = f64::from(span) / 8.0 + 1.0 / 16.0;
            let least = roots.iter().copied().filter(|r| *r > 0.0 && *r < span).fold(f64::INFINITY, f64::min);
            let polynomial = product(&roots, &pairs);
            let found = first_root(&polynomial, span);
            if least.is_finite() {
                // p = g (t - root)^m nearby, so a rounding error e of its value moves the root by (e/g)^(1/m).
                let multiplicity = roots.iter().filter(|r| **r == least).count() as f64;
                let others: f64 = roots.iter().filter(|r| **r != least).map(|r| (least - r).abs()).product();
                let slope = others * pairs.iter().map(|(a, b)| (least - a).powi(2) + b * b).product::<f64>();
                let size = polynomial.iter().rev().fold(0.0, |sum, c| sum * span + c.abs());
                let noise = 8.0 * polynomial.len() as f64 * f64::EPSILON * size;
                let accuracy = 2.0 * (noise / slope).powf(1.0 / multiplicity);
                prop_assert!((found.unwrap() - least).abs() <= accuracy, "{found:?} for {least} within {accuracy:e}");
            } else {
                prop_assert_eq!(found, None);
            }
        }
    }

    #[test]
    fn a_touching_root_is_found_and_a_near_miss_is_not() {
        // (t - 1/2)² on a step where both ends are positive.
        let touch = first_root(&[0.25, -1.0, 1.0], 2.0).unwrap();
        assert!((touch - 0.5).abs() < 1e-6, "{touch}");
        assert_eq!(first_root(&[0.25 + 1e-9, -1.0, 1.0], 2.0), None);
        // A pair 2e-5 apart inside one step: the earlier.
        let pair = first_root(&[0.25 - 1e-10, -1.0, 1.0], 2.0).unwrap();
        assert!((pair - (0.5 - 1e-5)).abs() < 1e-9, "{pair}");
    }

    #[test]
    fn a_root_at_the_end_of_the_span_counts_and_one_at_its_start_does_not() {
        assert_eq!(first_root(&[-1.0, 1.0], 1.0), Some(1.0));
        assert_eq!(first_root(&[0.0, 1.0], 1.0), None);
        assert_eq!(first_root(&[0.0, 0.0, -0.5, 1.0], 1.0).map(|t| (t - 0.5).abs() < 1e-15), Some(true));
        assert_eq!(first_root(&[1.0, 1.0], 1.0), None);
        assert_eq!(first_root(&[], 1.0), None);
        assert_eq!(first_root(&[0.0], 1.0), None);
    }

    #[test]
    fn a_root_just_behind_the_span_is_not_on_it() {
        // A pair of complex roots by the real line has the boxes halved, so that their widths do not fill the span.
        for root in [1.001, 1.01, 1.1, 1.4] {
            for near in [0.1, 0.3, 0.55, 0.7, 0.8, 0.9, 0.95] {
                for off in [1e-2, 1e-3] {
                    assert_eq!(first_root(&product(&[root], &[(near, off)]), 1.0), None, "{root}, {near}, {off}");
                }
            }
        }
    }

    #[test]
    fn a_miss_is_told_from_a_touch_down_to_the_noise() {
        // 12 epsilons of 1/4 + 2 + 4: 1.7e-14.
        assert!(first_root(&[0.25 + 1.4e-14, -1.0, 1.0], 2.0).is_some());
        assert_eq!(first_root(&[0.25 + 2.1e-14, -1.0, 1.0], 2.0), None);
    }

    #[test]
    fn the_scale_of_a_polynomial_does_not_matter() {
        for scale in [1e-300, 1e-170, 1.0, 1e170, 1e300] {
            let root = first_root(&[-0.06 * scale, 0.5 * scale, -scale], 1.0).unwrap();
            assert!((root - 0.2).abs() < 2e-16, "{root} at scale {scale}");
        }
        // A power of two rounds nothing: simple, double and triple roots, the end, a near miss.
        let (apart, double, triple) =
            (product(&[0.2, 0.3], &[]), product(&[0.25, 0.25, 0.75], &[]), product(&[0.7; 3], &[]));
        for polynomial in [apart, double, triple, product(&[1.0], &[]), product(&[0.375, 0.5, 0.625], &[(0.1, 0.01)])] {
            let root = first_root(&polynomial, 1.0);
            assert!(root.is_some());
            for exponent in [-900, -500, 500, 900] {
                let scaled: Vec<f64> = polynomial.iter().map(|c| c * 2_f64.powi(exponent)).collect();
                assert_eq!(first_root(&scaled, 1.0), root, "{polynomial:?} times 2^{exponent}");
            }
        }
    }

    /// The law `F = 1` (mass one) from V = 1: rest at t = 1, x = 1/2.
    fn parabola(t: f64) -> State {
        State { time: t, depth: t - 0.5 * t * t, velocity: 1.0 - t }
    }

    fn constant_force(end: f64) -> Stage {
        Stage { static_force: 1.0, stiffness: 0.0, viscosity: 0.0, drag: 0.0, end }
    }

    #[test]
    fn a_step_over_both_crossings_of_a_boundary_finds_the_first() {
        // x = 3/8 is crossed at t = 1/2 and t = 3/2, x = 1/2 is touched at t = 1; the step of length 8 ends at x < 0.
        for (end, time, velocity) in [(0.375, 0.5, 0.5), (0.5, 1.0, 0.0), (0.5 - 0.5e-12, 1.0 - 1e-6, 1e-6)] {
            let law = constant_force(end);
            let Found::Inside(at_rest) = rest(&law, parabola, parabola(0.0), 8.0, &Closing::new(1e-16)) else {
                panic!("no rest found");
            };
            assert!((at_rest.time - 1.0).abs() < 1e-15 && (at_rest.depth - 0.5).abs() < 1e-16);
            let Found::Inside(passed) = passage(&law, parabola, at_rest, at_rest.time, true, &Closing::new(1e-16))
            else {
                panic!("no passage found");
            };
            assert!((passed.time - time).abs() < 1e-10 && (passed.velocity - velocity).abs() < 1e-10, "{passed:?}");
            assert_eq!(passed.depth, end);
        }
    }

    #[test]
    fn a_boundary_out_of_reach_sends_the_search_to_the_rest() {
        let law = constant_force(0.5 + 1e-9);
        assert_eq!(passage(&law, parabola, parabola(0.0), 8.0, false, &Closing::new(1e-16)), Found::RestFirst);
    }

    /// All four terms, none a round number, mass one.
    fn every_term(end: f64) -> Stage {
        Stage { static_force: 1.1, stiffness: 0.7, viscosity: 0.3, drag: 0.9, end }
    }

    /// The flight of [`every_term`] from x = 0 at `velocity`, summed to round-off for short times.
    fn course(velocity: f64) -> impl Fn(f64) -> State {
        let series = Series::<f64, 40>::new::<true, true, true>(&every_term(f64::INFINITY), velocity);
        move |t| series.at(t)
    }

    /// Time at which `value` changes its sign between 0 and `to`.
    fn crossing(mut to: f64, value: impl Fn(f64) -> f64) -> f64 {
        let (mut from, rising) = (0.0, value(to) > 0.0);
        for _ in 0..200 {
            let middle = 0.5 * (from + to);
            if (value(middle) > 0.0) == rising { to = middle } else { from = middle }
        }
        0.5 * (from + to)
    }

    /// The constants of one law, measured: a wrong term leaves a correction of lower order, whose constant is far off.
    #[test]
    fn one_correction_is_of_fourth_order_and_states_its_error() {
        let closing = Closing::new(1e-16);
        let near = |value: f64, measured: f64| (value / measured - 1.0).abs() < 0.02;
        // By the quadratic far away, by the inverse series near by: error over t⁴, and the stated error over the true.
        for (velocity, constant, stated) in
            [(0.3, -0.374, 0.402), (0.2, -0.226, 0.262), (0.1, 0.0895, 4.09), (0.015, 0.0744, 3.28)]
        {
            let at = course(velocity);
            let rest = crossing(0.5, |t| at(t).velocity);
            let to = to_rest(&Jet::at(&every_term(f64::INFINITY), &at(0.0)), velocity, &closing);
            let (order, bound) = ((to.time - rest) / rest.powi(4), to.error / at(to.time).velocity.abs());
            assert!(near(order, constant) && near(bound, stated), "{velocity}: {order}, {bound}");
        }
        // The same for a part of the way to rest, over t⁵.
        for (velocity, part, constant, stated) in [
            (0.3, 0.9, -0.742, 9.75),
            (0.3, 0.5, 0.301, 4.19),
            (0.2, 0.2, 0.239, 4.49),
            (0.3, 0.05, -236.0, 2.11),
            (0.03, 0.05, -1.58e6, 1.51),
        ] {
            let at = course(velocity);
            let rest = crossing(0.5, |t| at(t).velocity);
            let law = every_term(part * at(rest).depth);
            let passage = crossing(rest, |t| at(t).depth - law.end);
            let to = to_depth(&law, &Jet::at(&law, &at(0.0)), &at(0.0), &closing).unwrap();
            let (order, bound) =
                ((to.time - passage) / passage.powi(5), to.error / (at(to.time).depth - law.end).abs());
            assert!(near(order, constant) && near(bound, stated), "{velocity}, {part}: {order}, {bound}");
        }
    }

    /// A near miss has the boxes narrowed, and they must widen behind it, or their number runs out.
    #[test]
    fn a_simple_root_on_a_corner_behind_a_near_miss_is_the_corner_itself() {
        for (near, off) in [(0.1, 1e-3), (0.1, 1e-5), (0.1, 1e-6), (0.296_875, 1.0 / 512.0)] {
            assert_eq!(first_root(&product(&[0.5], &[(near, off)]), 1.0), Some(0.5), "{near}, {off}");
        }
        for root in [0.8, 0.95] {
            let found = first_root(&product(&[root], &[(0.1, 1e-5)]), 1.0).unwrap();
            assert!((found - root).abs() < 1e-15, "{found} for {root}");
        }
    }

    #[test]
    fn where_nothing_is_told_from_zero_the_root_is_the_middle() {
        assert_eq!(first_root(&product(&[0.5; 40], &[]), 1.0), Some(0.5));
    }

    fn jet(first: f64, second: f64, third: f64) -> Jet<f64> {
        Jet { first, second, third }
    }

    /// Polynomials whose roots are known: the quadratic is exact where the cubic term is nothing, and one that would move
    /// the trial by more than a quarter is left out.
    #[test]
    fn a_trial_far_from_rest_is_the_root_of_the_parabola() {
        let to = |velocity, jet: Jet<f64>| {
            let correction = to_rest(&jet, velocity, &Closing::new(1e-8));
            (correction.time, correction.error)
        };
        assert_eq!(to(1.0, jet(-1.0, 0.0, 1.5)), (1.25, 0.1875));
        assert_eq!(to(1.0, jet(-1.0, 0.0, 3.0)), (1.0, f64::INFINITY));
        assert_eq!(to(1.0, jet(0.0, 1.0, 0.0)), (f64::INFINITY, f64::INFINITY));
        // 3 t² - t + 0.004925: so near that the series serves, were its error not ten times the tolerance.
        assert!((to(0.004_925, jet(-1.0, 6.0, 0.0)).0 - 0.005).abs() < 1e-17);
    }

    /// The same for a boundary, `D = t + ...`.
    #[test]
    fn a_trial_far_from_a_boundary_is_the_root_of_the_parabola() {
        let to = |end, jet: Jet<f64>, tolerance| {
            let start = State { time: 0.0, depth: 0.0, velocity: 1.0 };
            let correction = to_depth(&constant_force(end), &jet, &start, &Closing::new(tolerance)).unwrap();
            (correction.time, correction.error)
        };
        // Higher terms that move the trial by half, or turn the speed round.
        assert_eq!(to(1.0, jet(0.0, -1.2, 0.0), 1e-8), (1.0, f64::INFINITY));
        assert_eq!(to(1.0, jet(0.0, -10.0, 40.0), 1e-8), (1.0, f64::INFINITY));
        // t - 3 t² = 0.004925: the series would be off by three times the tolerance.
        assert!((to(0.004_925, jet(-6.0, 0.0, 0.0), 1e-9).0 - 0.005).abs() < 1e-17);
    }

    fn uniform(t: f64) -> State {
        State { time: t, depth: t, velocity: 1.0 }
    }

    fn no_force(end: f64) -> Stage {
        Stage { static_force: 0.0, ..constant_force(end) }
    }

    #[test]
    fn an_event_at_the_end_of_a_step_is_on_it_and_one_within_reach_behind_it_is_not() {
        let closing = Closing::new(1e-8);
        let law = constant_force(f64::INFINITY);
        assert_eq!(rest(&law, parabola, parabola(0.0), 1.0, &closing), Found::Inside(parabola(1.0)));
        assert_eq!(rest(&law, parabola, parabola(0.995), 0.999, &closing), Found::Beyond(parabola(0.999)));
        let pass = |end, from, span| passage(&no_force(end), uniform, uniform(from), span, false, &closing);
        assert_eq!(pass(1.0, 0.0, 1.0), Found::Inside(uniform(1.0)));
        assert_eq!(pass(0.9995, 0.995, 0.999), Found::Beyond(uniform(0.999)));
        // The speed vanishes at the end, short of the boundary; the law says nothing of the brake.
        assert_eq!(passage(&no_force(0.6), parabola, parabola(0.0), 1.0, false, &closing), Found::RestFirst);
    }

    /// Drag alone, M = 1, q = 2: V = 1/(1 + 2 t), x = ln(1 + 2 t)/2. The parabola at impact ends at x = 1/4.
    #[test]
    fn a_boundary_beyond_the_parabola_is_found_if_it_is_known_to_be_reached() {
        let law = Stage { drag: 2.0, ..no_force(0.6) };
        let at = |t: f64| State { time: t, depth: 0.5 * (2.0 * t).ln_1p(), velocity: 1.0 / (1.0 + 2.0 * t) };
        let find = |reached| passage(&law, at, at(0.0), 2.0, reached, &Closing::new(1e-16));
        assert_eq!(find(false), Found::RestFirst);
        let Found::Inside(passed) = find(true) else { panic!("no passage found") };
        assert!((passed.time - 0.5 * 1.2_f64.exp_m1()).abs() < 1e-14, "{passed:?}");
        assert!((passed.velocity - (-1.2_f64).exp()).abs() < 1e-14 && passed.depth == 0.6, "{passed:?}");
    }

    /// Laws a million times too weak, so that each correction leads out of the bracket.
    #[test]
    fn where_corrections_lead_astray_halving_finds_the_place() {
        let closing = Closing::new(1e-16);
        let weak = Stage { static_force: 1e-6, ..constant_force(0.3125) };
        let at = |t| State { time: t, depth: t, velocity: 0.3125 - t };
        let expected = State { time: 0.3125, depth: 0.3125, velocity: 0.0 };
        assert_eq!(rest(&weak, at, at(0.0), 1.0, &closing), Found::Inside(expected));
        let at = |t| State { time: t, depth: t, velocity: 1e-6 };
        let expected = State { velocity: 1e-6, ..expected };
        assert_eq!(passage(&no_force(0.3125), at, at(0.0), 1.0, false, &closing), Found::Inside(expected));
    }

    #[test]
    fn a_boundary_touched_has_a_speed_of_zero_without_a_sign() {
        let touching = State { time: 0.0, depth: 1.0, velocity: -0.0 };
        let touched = at_depth(&constant_force(1.0), &touching, &jet(-1.0, 0.0, 0.0), 0.0);
        assert_eq!(touched.velocity.to_bits(), 0);
    }
}
