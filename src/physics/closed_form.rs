//! The exact solution of one stage, and exact critical velocities.
//!
//! [`ClosedForm`](crate::integrators::ClosedForm) goes through the stages of a [`Problem`] with these formulas.
//!
//! A stage `M dV/dt = -(p + s x + r V + q V²)` is entered at time t0, depth x0, speed V0 and left at its limit
//! (its end, or the exit depth) or not at all. With `xi = x - x0`, `f = (p + s x)/M` the static deceleration and
//! `f0 = (p + s x0)/M`, three families have a solution in elementary functions:
//!
//! ```text
//! p, q (r = s = 0)   V² = V0² e^{-y} - (2 p xi/M) E(-y),  y = 2 q xi/M,  E(z) = expm1(z)/z
//!                    t  = tau T(tau sqrt(p q)/M),  tau = 2 xi E(-y)/(V + V0 e^{-y}),  T(z) = atan(z)/z (atanh for p < 0)
//!                    rest at xi = (M/(2 q)) log1p(q V0²/p),  tau = M V0/p
//! p, s (q = r = 0)   V² = V0² - xi (f0 + f),  t = atan2(w (f V0 - f0 V), w² V V0 + f0 f)/w,  w² = s/M
//!                    rest at xi = V0²/(f0 + hypot(f0, w V0)),  T = atan2(w V0, f0)/w
//! p, s (s < 0)       as before with hyperbolic functions: t = log1p(...)/l, l² = -s/M
//! p, s, r (q = 0)    damped oscillation: xi(t) and V(t), rest at an elementary time; passing a depth is one scalar root
//! ```
//!
//! The form for `tau` is derived here: it follows from `V0 - V = (2 xi/M) E(-y) (p + q V0²)/(V0 + V)`, and it needs no
//! difference of nearly equal speeds, holds for p of either sign and through p = 0, q = 0 and terminal velocity.
//! The crater (Eq. 4) is `s` alone, the tunnel (Eq. 5) `p, q`. Stages with r and q, or with s and q, have no form
//! here: of the latter the speed over depth is known ([`squared_speed_at`]), the time is not.
//!
//! Accuracy: depth, times and velocities (these relative to V0), critical velocity and energy stay within
//! 8 ulp x max(1, condition number) of the 50-digit reference ([`super::reference`]); the worst of 40,000 random
//! flights through crater and tunnel was 2.6.
//!
//! Source: Li & Chen (2003) for crater and tunnel; the others from the linear and separable equations above.

use thiserror::Error;

use super::exit_energy::{expm1_over, propagate};
use super::problem::{Problem, Stage, StageEnd, State};
use super::scalar::Differentiable;
use super::scene::CraterStiffness;

/// `W = V²` (m²/s²) at `depth`, continued below zero beyond rest; `None` when a stage before `depth` has r > 0.
///
/// It covers stages with stiffness and drag together, of which the time is not known.
pub fn squared_speed_at<S: Differentiable>(problem: &Problem<S>, depth: S) -> Option<S> {
    let mut w = problem.impact_speed * problem.impact_speed;
    let mut from = S::zero();
    for stage in &problem.stages {
        let last = stage.end.value() >= depth.value();
        let to = if last { depth } else { stage.end };
        if to.value() > from.value() {
            if stage.viscosity.value() > 0.0 {
                return None;
            }
            w = propagate(stage, problem.mass, w, from, to);
            from = to;
        }
        if last {
            break;
        }
    }
    Some(w)
}

/// The end of a stage at `limit`, `time` (s) after `entry`, with `velocity` (m/s).
fn passes(entry: State, limit: f64, time: f64, velocity: f64) -> StageEnd {
    StageEnd::Limit(State { time: entry.time + time, depth: limit, velocity })
}

/// Rest, `time` (s) and `distance` (m) after `entry`.
fn rests(entry: State, time: f64, distance: f64) -> StageEnd {
    StageEnd::Rest(State { time: entry.time + time, depth: entry.depth + distance, velocity: 0.0 })
}

/// One stage from `entry` (V > 0) to `limit` (beyond it, possibly infinite).
// A state that is given back through memory is stored in halves and loaded whole, which stalls.
#[inline(always)]
pub(crate) fn cross(stage: &Stage, mass: f64, entry: State, limit: f64) -> Result<StageEnd, &'static str> {
    match (stage.stiffness > 0.0, stage.viscosity > 0.0, stage.drag > 0.0) {
        (false, false, false) if stage.stiffness < 0.0 => Ok(cross_falling(stage, mass, entry, limit)),
        (false, ..) if stage.stiffness < 0.0 => Err("its force falls with depth, and viscosity or drag acts beside"),
        (false, false, _) => Ok(cross_drag(stage, mass, entry, limit)),
        (true, false, false) => Ok(cross_spring(stage, mass, entry, limit)),
        (_, true, false) => Ok(cross_viscous(stage, mass, entry, limit)),
        (true, false, true) => Err("stiffness and drag together give the speed over depth but no elementary time"),
        (_, true, true) => Err("viscosity and drag act together"),
    }
}

/// `F = p + q V²`, p of any sign, q >= 0: the tunnel, constant force, drag alone, free flight.
#[inline(always)]
fn cross_drag(stage: &Stage, mass: f64, entry: State, limit: f64) -> StageEnd {
    let (p, q, v0) = (stage.static_force, stage.drag, entry.velocity);
    let xi = limit - entry.depth;
    if limit.is_finite() {
        let decay = Decay::over(2.0 * q * xi / mass);
        let w = v0 * v0 * decay.end - 2.0 * p * xi / mass * decay.mean;
        if w >= 0.0 {
            // Without a static force w may underflow where its root does not.
            let v = if p == 0.0 { v0 * (-0.5 * decay.y).exp() } else { w.sqrt() };
            return passes(entry, limit, drag_time(stage, mass, xi, &decay, v0, v), v);
        }
    }
    if p > 0.0 {
        let u = q * v0 * v0 / p;
        let tau = mass * v0 / p;
        // Below 1e-200 the logarithm equals u, and u may have lost its digits.
        let distance = if u > 1e-200 { 0.5 * mass / q * u.ln_1p() } else { 0.5 * tau * v0 };
        return rests(entry, tau * atan_over(u.sqrt()), distance);
    }
    let why = match (p < 0.0, q > 0.0) {
        (true, _) => "the last stage drives the projectile",
        (false, true) => "drag alone never brings it to rest",
        (false, false) => "no force acts in the last stage",
    };
    StageEnd::Approach(entry, why)
}

/// Time (s) from speed `v0` to `v` over the distance `xi` under `p + q V²`.
fn drag_time(stage: &Stage, mass: f64, xi: f64, decay: &Decay, v0: f64, v: f64) -> f64 {
    let (p, q) = (stage.static_force, stage.drag);
    if p == 0.0 {
        // tau with V = V0 e^{-y/2}, freed of the exponentials that underflow: (xi/V0) E(y/2).
        return xi / v0 * expm1_over(0.5 * decay.y);
    }
    let tau = 2.0 * xi * decay.mean / (v + v0 * decay.end);
    if p > 0.0 {
        // Two roots: the product of small forces and drags underflows where the quotient by the mass does not.
        return tau * atan_over(p.sqrt() * q.sqrt() * tau / mass);
    }
    let rate = (-p).sqrt() * q.sqrt() / mass;
    let z = rate * tau;
    if z < 0.5 {
        return tau * atanh_over(z);
    }
    // Near terminal velocity Vt the argument goes to one: atanh in logarithms, with V² - Vt² = (V0² - Vt²) e^{-y}.
    let terminal = (-p / q).sqrt();
    (0.5 * decay.y + ((v + terminal) / (v0 + terminal)).ln()) / rate
}

/// What is left of W after a distance with `y = 2 q xi/M`, and on average over it.
struct Decay {
    /// y, not negative.
    y: f64,
    /// `e^{-y}`.
    end: f64,
    /// `E(-y) = (1 - e^{-y})/y`.
    mean: f64,
}

impl Decay {
    /// Both at the price of one exponential.
    #[inline]
    fn over(y: f64) -> Self {
        if y == 0.0 {
            Self { y, end: 1.0, mean: 1.0 }
        } else if y < 0.7 {
            let lost = -(-y).exp_m1();
            Self { y, end: 1.0 - lost, mean: lost / y }
        } else {
            // Below one half the exponential is subtracted from 1 without loss.
            let end = (-y).exp();
            Self { y, end, mean: (1.0 - end) / y }
        }
    }
}

/// `F = p + s x`, s > 0: the crater, and a spring that may be pulled first (p + s x < 0).
#[inline(always)]
fn cross_spring(stage: &Stage, mass: f64, entry: State, limit: f64) -> StageEnd {
    let v0 = entry.velocity;
    let w = (stage.stiffness / mass).sqrt();
    let f0 = (stage.static_force + stage.stiffness * entry.depth) / mass;
    let xi = limit - entry.depth;
    if f0 == 0.0 {
        // The spring is entered where it is slack: the crater, and the hot path.
        return cross_slack_spring(w, entry, limit, (v0 - w * xi) * (v0 + w * xi));
    }
    if limit.is_finite() {
        let f = (stage.static_force + stage.stiffness * limit) / mass;
        let energy = v0 * v0 - xi * (f0 + f);
        if energy >= 0.0 {
            let v = energy.sqrt();
            // f V0 - f0 V; of the two terms the second is at worst minus half of the first.
            let crossed = xi * (w * w * v0 + f0 * ((f0 + f) / (v0 + v)));
            return passes(entry, limit, (w * crossed).atan2(w * w * v * v0 + f0 * f) / w, v);
        }
    }
    let reach = f0.hypot(w * v0);
    let distance = if f0 > 0.0 { v0 * (v0 / (f0 + reach)) } else { (reach - f0) / (w * w) };
    rests(entry, (w * v0).atan2(f0) / w, distance)
}

/// A spring of frequency `w` from its slack end, with V² `squared_speed` at `limit`, continued below zero.
#[inline(always)]
fn cross_slack_spring(w: f64, entry: State, limit: f64, squared_speed: f64) -> StageEnd {
    let xi = limit - entry.depth;
    if squared_speed >= 0.0 {
        let v = squared_speed.sqrt();
        passes(entry, limit, (w * xi).atan2(v) / w, v)
    } else {
        rests(entry, std::f64::consts::FRAC_PI_2 / w, entry.velocity / w)
    }
}

/// `F = p + s x`, s < 0, of one sign up to `limit`: a piece of a table (docs/theory.md, section 9).
///
/// With `l² = -s/M`, `l V + f` falls as `e^{-l t}` and `l V - f` rises as `e^{l t}`. Of the two, that one serves in which
/// nothing cancels; and its change is a sum of terms of one sign, as f falls over x and V follows F:
///
/// ```text
/// l t = log1p((l |V0 - V| + l² xi)/(l V + |f|)),   |V0 - V| = xi |f0 + f|/(V0 + V)
/// ```
///
/// with V and f at the end where F resists, at the start where it drives.
#[cold]
#[inline(never)]
fn cross_falling(stage: &Stage, mass: f64, entry: State, limit: f64) -> StageEnd {
    let v0 = entry.velocity;
    let rate = (-stage.stiffness / mass).sqrt();
    let f0 = (stage.static_force + stage.stiffness * entry.depth) / mass;
    let time = |xi: f64, change: f64, v: f64, f: f64| {
        // Where one of the two is a rounding, of either sign, the other tells.
        let (slow_v, slow_f) = if f0 + f > 0.0 { (v, f) } else { (v0, f0) };
        ((rate * change + rate * rate * xi) / (rate * slow_v + slow_f.abs())).ln_1p() / rate
    };
    let xi = limit - entry.depth;
    let f = (stage.static_force + stage.stiffness * limit) / mass;
    let energy = v0 * v0 - xi * (f0 + f);
    // What is left of f where V vanishes, as far as it does; with none it is only approached.
    let left = (f0 - rate * v0) * (f0 + rate * v0);
    if energy >= 0.0 || f0 <= 0.0 || left <= 0.0 {
        let v = energy.max(0.0).sqrt();
        let elapsed = time(xi, xi * ((f0 + f) / (v0 + v)).abs(), v, f);
        // Where the force vanishes with the speed, until an epsilon of the speed is left.
        let elapsed = if elapsed.is_finite() { elapsed } else { -f64::EPSILON.ln() / rate };
        return passes(entry, limit, elapsed, v);
    }
    let f = left.sqrt();
    let xi = v0 * (v0 / (f0 + f));
    rests(entry, time(xi, v0, 0.0, f), xi)
}

/// `F = p + s x + r V`, r > 0: a damped oscillator, or drag in proportion to speed when s = 0.
///
/// Never inlined: the hot path has no viscosity.
#[inline(never)]
fn cross_viscous(stage: &Stage, mass: f64, entry: State, limit: f64) -> StageEnd {
    let motion = Damped::new(stage, mass, entry);
    let to_limit = limit - entry.depth;
    if stage.static_force == 0.0 && stage.stiffness == 0.0 {
        // Viscosity alone: the speed falls by r/M for each metre.
        let lost = motion.fast * to_limit / motion.v0;
        return if lost < 1.0 {
            passes(entry, limit, -(-lost).ln_1p() / motion.fast, motion.v0 * (1.0 - lost))
        } else {
            StageEnd::Approach(entry, "viscosity alone never brings it to rest")
        };
    }
    let rest = motion.rest_time();
    if let Some(time) = rest {
        let (distance, _) = motion.after(time);
        if distance < to_limit {
            return rests(entry, time, distance);
        }
    }
    if limit.is_infinite() {
        return StageEnd::Approach(entry, "its drive and its viscosity balance");
    }
    match motion.time_over(to_limit, rest) {
        Some(time) => passes(entry, limit, time, motion.after(time).1.max(0.0)),
        None => StageEnd::Approach(entry, "it creeps towards a depth that it never reaches"),
    }
}

/// The linear motion `u'' + 2 g u' + w² u = 0`, `u = x + p/s`, from `u' = V0` and `w² u = f0`.
struct Damped {
    /// Speed at the start (m/s).
    v0: f64,
    /// Static deceleration at the start `f0 = (p + s x0)/M` (m/s²).
    f0: f64,
    /// `w² = s/M` [1/s²].
    w2: f64,
    /// `g = r/(2 M)` [1/s].
    g: f64,
    /// `|g² - w²|^(1/2)` [1/s].
    m: f64,
    /// Sign of `g² - w²`: overdamped, critical, underdamped.
    damping: std::cmp::Ordering,
    /// Overdamped: the fast rate `l1 = g + m` [1/s].
    fast: f64,
    /// Overdamped: the slow rate `l2 = w²/l1` [1/s], not from `g - m`, which cancels.
    slow: f64,
}

impl Damped {
    fn new(stage: &Stage, mass: f64, entry: State) -> Self {
        let w2 = stage.stiffness / mass;
        let w = w2.sqrt();
        let g = 0.5 * stage.viscosity / mass;
        let m = ((g - w).abs() * (g + w)).sqrt();
        Self {
            v0: entry.velocity,
            f0: (stage.static_force + stage.stiffness * entry.depth) / mass,
            w2,
            g,
            m,
            damping: g.total_cmp(&w),
            fast: g + m,
            slow: w2 / (g + m),
        }
    }

    /// Distance (m) and speed (m/s) after time `t` (s).
    fn after(&self, t: f64) -> (f64, f64) {
        let Self { v0, f0, w2, g, m, .. } = *self;
        // 1 - e^(-gt) (cos + g sin) cancels where (g + w) t is small: so far in parts, each by its series.
        let turn = (g + w2.sqrt()) * t;
        if turn < 2.0 {
            let parts = (2.0 * turn).ceil().max(1.0);
            let (mut distance, mut speed) = (0.0, v0);
            for _ in 0..parts as u32 {
                let (more, end) = self.series(speed, f0 + w2 * distance, t / parts);
                (distance, speed) = (distance + more, end);
            }
            return (distance, speed);
        }
        // Sums of two decays; nearer to critical damping their difference would cancel.
        if self.damping.is_gt() && m * t > 1.0 {
            let (fast, slow) = (self.fast, self.slow);
            let gap = 2.0 * m;
            let (fast_decay, slow_decay) = ((-fast * t).exp(), (-slow * t).exp());
            let impulse = slow_decay * -(-gap * t).exp_m1() / gap;
            // The first cancels near critical damping, the second where the slow decay has hardly begun.
            let step = if slow * t < 0.5 {
                t * (expm1_over(-slow * t) - expm1_over(-fast * t)) / gap
            } else {
                (1.0 - (fast * slow_decay - slow * fast_decay) / gap) / w2
            };
            let speed = ((fast * v0 + f0) * fast_decay - (slow * v0 + f0) * slow_decay) / gap;
            return (v0 * impulse - f0 * step, speed);
        }
        let (cosine, sine) = match self.damping {
            std::cmp::Ordering::Greater => ((m * t).cosh(), (m * t).sinh() / m),
            std::cmp::Ordering::Equal => (1.0, t),
            std::cmp::Ordering::Less => ((m * t).cos(), (m * t).sin() / m),
        };
        let decay = (-g * t).exp();
        let impulse = decay * sine;
        // Here g is near w or below it, so that w² t² is no less than 1.
        let step = (1.0 - decay * (cosine + g * sine)) / w2;
        (v0 * impulse - f0 * step, decay * (v0 * cosine - (g * v0 + f0) * sine))
    }

    /// Distance (m) and speed (m/s) after time `t` (s), `(g + w) t` at most 1/2, by the Taylor series of u.
    ///
    /// 20 terms leave less than 1e-18 of the sum, and nothing cancels to first order.
    fn series(&self, v0: f64, f0: f64, t: f64) -> (f64, f64) {
        let Self { w2, g, .. } = *self;
        let (mut u1, mut u2) = (v0 * t, -0.5 * (2.0 * g * v0 + f0) * t * t);
        let (mut distance, mut speed) = (u1 + u2, u1 + 2.0 * u2);
        for n in 1..20_u32 {
            let n = f64::from(n);
            let u3 = -(2.0 * g * t * (n + 1.0) * u2 + w2 * t * t * u1) / ((n + 2.0) * (n + 1.0));
            distance += u3;
            speed += (n + 2.0) * u3;
            (u1, u2) = (u2, u3);
        }
        (distance, speed / t)
    }

    /// Time until rest (s); `None` when overdamped and driven so that it never rests.
    fn rest_time(&self) -> Option<f64> {
        let Self { v0, f0, g, m, .. } = *self;
        let brake = g * v0 + f0;
        match self.damping {
            std::cmp::Ordering::Less => Some((m * v0).atan2(brake) / m),
            std::cmp::Ordering::Equal => (brake > 0.0).then(|| v0 / brake),
            std::cmp::Ordering::Greater => {
                // D - m V0 = f0 + l2 V0, without the cancellation.
                let slow_brake = f0 + self.slow * v0;
                (slow_brake > 0.0).then(|| (2.0 * m * v0 / slow_brake).ln_1p() / (2.0 * m))
            }
        }
    }

    /// Time to cover `distance` (m), which is reached before `rest` if there is one.
    ///
    /// Newton steps inside a bracket that only shrinks, halved where they would leave it. `None` when the distance is
    /// only approached.
    fn time_over(&self, distance: f64, rest: Option<f64>) -> Option<f64> {
        // It creeps towards the depth where spring and drive balance, and rounding would let it arrive.
        if rest.is_none() && self.w2 * distance >= -self.f0 {
            return None;
        }
        let mut low = 0.0;
        let mut high = rest.unwrap_or(distance / self.v0);
        let mut doublings = 0;
        while rest.is_none() && self.after(high).0 < distance {
            high *= 2.0;
            doublings += 1;
            // 2^200 times the free-flight time: the motion is over.
            if doublings > 200 {
                return None;
            }
        }
        let mut t = (distance / self.v0).min(high);
        for _ in 0..200 {
            let (covered, speed) = self.after(t);
            let excess = covered - distance;
            if excess == 0.0 {
                return Some(t);
            }
            if excess < 0.0 {
                low = t;
            } else {
                high = t;
            }
            let newton = t - excess / speed;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - t).abs() <= f64::EPSILON * t {
                return Some(next);
            }
            t = next;
        }
        Some(t)
    }
}

/// `atan(z)/z`, 1 at zero.
#[inline]
fn atan_over(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { z.atan() / z }
}

/// A force linear in V, `F = f + r (V - v)`, r of any sign: a piece of a table of velocity, and the speed at which it ends.
///
/// With `dV = V0 - V`, `u = F/F0 - 1` and the means `A = ln(1+u)/u`, `C = ((1+u) ln(1+u) - u)/u²` of `1/(1+us)` and
/// `(1-s)/(1+us)` over s from 0 to 1:
///
/// ```text
/// t(V) = (M dV/F0) A,   x(V) = (M dV/F0) (V A + dV C)
/// V(t) = V0 - (F0 t/M) E(-r t/M),   x(t) = V0 t - (F0 t²/M) E2(-r t/M),   E(z) = expm1(z)/z, E2(z) = (expm1(z) - z)/z²
/// ```
///
/// t(x) is the root of x(t), to which Newton's method comes from one side, as V keeps its sign and only falls or rises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    /// f (N).
    pub(crate) force: f64,
    /// r (kg/s).
    pub(crate) slope: f64,
    /// v (m/s).
    pub(crate) velocity: f64,
    /// Where it ends (m/s), on the side to which V goes; rest without one.
    pub(crate) end: Option<f64>,
}

/// Bound on the steps of Newton's method for the time at a depth: it takes six as a rule, fifty at a double root.
const TIME_STEPS_MAX: u32 = 200;

impl Line {
    /// F (N) at `v` (m/s).
    pub(crate) fn force(&self, v: f64) -> f64 {
        self.force + self.slope * (v - self.velocity)
    }

    /// The state `time` (s) after `entry`.
    pub(crate) fn after(&self, mass: f64, entry: State, time: f64) -> State {
        let (rate, deceleration) = (self.slope / mass, self.force(entry.velocity) / mass);
        let z = -rate * time;
        let velocity = entry.velocity - deceleration * time * expm1_over(z);
        let distance = if z.abs() < 1.0 || self.slope < 0.0 {
            time * (entry.velocity - deceleration * time * expm1_over_twice(z))
        } else {
            // About the speed at which F is zero.
            let excess = deceleration / rate;
            (entry.velocity - excess) * time - excess * z.exp_m1() / rate
        };
        State { time: entry.time + time, depth: entry.depth + distance, velocity }
    }

    /// From `entry` to the end of the piece, to rest, or to `limit` before that.
    pub(crate) fn cross(&self, mass: f64, entry: State, limit: f64) -> StageEnd {
        let (v0, room) = (entry.velocity, limit - entry.depth);
        let force = self.force(v0);
        let end = self.end.unwrap_or(0.0);
        let (fall, at_end) = (v0 - end, self.force(end));
        let u = at_end / force - 1.0;
        // A force that vanishes with V is approached, from a distance that is finite.
        if end == 0.0 && at_end == 0.0 {
            let viscous = Stage { viscosity: self.slope, ..Stage::free() };
            return cross_viscous(&viscous, mass, entry, limit);
        }
        let gets_there = force != 0.0 && u > -1.0;
        if gets_there {
            let (mean, late) = means(u);
            let time = mass * fall / force * mean;
            let distance = mass * fall / force * (end * mean + fall * late);
            if distance <= room && time.is_finite() {
                let state = State { time: entry.time + time, depth: entry.depth + distance, velocity: end };
                return if end == 0.0 { rests(entry, time, distance) } else { StageEnd::Condition(state) };
            }
        }
        if room == f64::INFINITY {
            return StageEnd::Approach(entry, "the force of its table vanishes at a speed");
        }
        // x(t) bends one way, and V0 t lies on the side from which no step goes too far.
        let mut time = room / v0;
        for _ in 0..TIME_STEPS_MAX {
            let here = self.after(mass, entry, time);
            let next = time + (room - (here.depth - entry.depth)) / here.velocity;
            let is_last = !((next - time).abs() > f64::EPSILON * time) || here.velocity <= 0.0;
            if !is_last {
                time = next;
                continue;
            }
            break;
        }
        let there = self.after(mass, entry, time);
        let (low, high) = if force > 0.0 { (end, v0) } else { (v0, end.max(v0)) };
        passes(entry, limit, time, there.velocity.clamp(low, high))
    }
}

/// `A` and `C` of [`Line`], for a `change` u > -1.
fn means(change: f64) -> (f64, f64) {
    if change.abs() < 0.1 {
        // Both by their series: the integrals of (-us)^k and (1-s) (-us)^k.
        let (mut mean, mut late, mut power) = (0.0, 0.0, 1.0);
        for k in 0..MEAN_TERMS {
            let order = f64::from(k) + 1.0;
            mean += power / order;
            late += power / (order * (order + 1.0));
            power *= -change;
        }
        return (mean, late);
    }
    let log = change.ln_1p();
    (log / change, ((1.0 + change) * log - change) / (change * change))
}

/// Terms of a series in u, at most a tenth.
const MEAN_TERMS: u32 = 17;

/// `(expm1(z) - z)/z²`, half at zero.
fn expm1_over_twice(z: f64) -> f64 {
    if z.abs() < 1.0 {
        let (mut term, mut sum) = (0.5, 0.0);
        for k in 3..22 {
            sum += term;
            term *= z / f64::from(k);
        }
        return sum;
    }
    (z.exp_m1() - z) / (z * z)
}

/// `atanh(z)/z`, 1 at zero.
fn atanh_over(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { z.atanh() / z }
}

/// Bound of the round-off error of the exit margin.
///
/// Every stage forms W from W at its start and the work done in it with at most eight roundings, each of half an
/// epsilon of the larger of the two: `e^{-y}` counts three of them however large y is, as `y e^{-y} < 1`. A depth of
/// rest off by two epsilons shifts the margin by that part of `2 |F| X/(M V0²)`. Both are within eight epsilons of
///
/// ```text
/// 1 + |margin| + sum over stages entered of (2/(M V0²)) (|p| b + s b²/2),   b = min(end, depth of the end)
/// ```
///
/// for each stage before the exit.
pub(crate) fn margin_error(problem: &Problem, stage: usize, depth: f64, margin: f64) -> f64 {
    let v0 = problem.impact_speed;
    // Crater and tunnel are asked nothing.
    let count = problem.stages.len();
    if count > 2 && (count > FEW_STAGES || problem.stages.iter().any(|law| law.stiffness < 0.0)) {
        return margin_error_of_many(problem, stage, depth, margin);
    }
    let mut size = 1.0 + margin.abs();
    for law in &problem.stages[..=stage] {
        let to = if law.end < depth { law.end } else { depth };
        size += 2.0 * (law.static_force.abs() + 0.5 * law.stiffness.abs() * to) * to / problem.mass / v0 / v0;
    }
    let before_exit = problem.stages.iter().take_while(|law| law.end < problem.exit_depth).count() + 1;
    8.0 * f64::EPSILON * size * before_exit as f64
}

/// Stages of which each may count with the work from the face to its end; there are more in tables.
const FEW_STAGES: usize = 64;

/// As [`margin_error`], for pieces of a table: p and s x, which nearly cancel, count over the length of the piece alone.
///
/// ```text
/// 8 eps sum over stages entered of W/V0² + (2/(M V0²)) (|p| + |s| b) (b - a)    from a to b
/// ```
///
/// and 8 eps of the largest of these for each stage beyond, up to the exit.
#[cold]
fn margin_error_of_many(problem: &Problem, stage: usize, depth: f64, margin: f64) -> f64 {
    let per_energy = |work: f64| 2.0 * work / problem.mass / problem.impact_speed / problem.impact_speed;
    let (mut w, mut greatest, mut sum, mut ahead) = (1.0_f64, 1.0_f64, margin.abs(), 0.0);
    for (index, law) in problem.stages.iter().enumerate() {
        let (from, to) = (problem.start_of(index), problem.limit_of(index));
        let to = if to.is_finite() { to } else { depth };
        if to > from {
            let size = (law.static_force.abs() + law.stiffness.abs() * to) * (to - from);
            w = (w - per_energy(law.static_work(from, to))).abs();
            greatest = greatest.max(w + per_energy(size));
            sum += greatest;
            ahead += f64::from(u8::from(index > stage));
        }
        if law.end >= problem.exit_depth || (index >= stage && !problem.has_exit()) {
            break;
        }
    }
    8.0 * f64::EPSILON * (sum + ahead * greatest)
}

/// The continuous crater from the face to `limit`, without c.
pub(crate) fn cross_continuous_crater(problem: &Problem, limit: f64) -> StageEnd {
    let (mass, v0) = (problem.mass, problem.impact_speed);
    let (kd, Stage { static_force: p, drag: q, .. }) = problem.crater_depth_and_tunnel();
    let w = (problem.stages[0].stiffness / mass).sqrt();
    let squared_speed =
        (v0 * v0 * (kd * mass + q * (kd - limit) * (kd + limit)) - limit * limit * p) / (kd * (mass + kd * q));
    cross_slack_spring(w, State::at_impact(problem), limit, squared_speed)
}

/// The impact speed that just perforates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Critical {
    /// Critical velocity `V_c` (m/s).
    pub velocity: f64,
    /// Critical energy `E_c = M V_c²/2` (J).
    pub energy: f64,
}

impl Critical {
    fn new(mass: f64, energy: f64) -> Result<Self, CriticalError> {
        // Two roots: V_c² may be out of range where V_c and E_c are not.
        let critical = Self { velocity: energy.sqrt() * (2.0 / mass).sqrt(), energy };
        if critical.energy.is_finite() && critical.velocity.is_finite() {
            Ok(critical)
        } else {
            Err(CriticalError::OutOfRange)
        }
    }
}

/// Why there is no critical velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CriticalError {
    /// A semi-infinite target is never perforated.
    #[error("the target has no far side")]
    NoExit,
    /// The critical energy is not a 64-bit number: the drag multiplies it by e for every M/(2 Q) of depth.
    #[error("the critical energy leaves the range of 64-bit numbers: the drag over the thickness is too large")]
    OutOfRange,
    /// A stage with viscosity loses energy in proportion to the path's speed, so W(exit) is not affine in V0².
    #[error("stage {0} is viscous: the critical velocity has no closed form")]
    Viscous(usize),
}

/// Critical velocity of crater and tunnel: the impact speed with `X = H`, the exit depth of `problem`.
///
/// ```text
/// continuous c, H <= k d :  E_c = H² P/(2 (k d + (Q/M) (k d - H)(k d + H)))
/// continuous c, H >  k d :  E_c = E1c (1 + k d Q/M) + k d P/2,   E1c = P (H - k d) E(2 Q (H - k d)/M)
/// c given                :  E_c = c H²/2                  and    E_c = E1c + c (k d)²/2
/// ```
///
/// with `E(z) = expm1(z)/z` and `V_c² = 2 E_c/M`: docs/theory.md, section 2, in energies, which overflow later. The
/// impact speed of `problem` and a continuous c, which depends on it, are not used. Of layers, only H <= k d is exact.
///
/// # Errors
/// [`CriticalError::NoExit`] for an infinite exit depth, [`CriticalError::OutOfRange`] beyond 1e308 J.
pub fn critical(problem: &Problem, stiffness: CraterStiffness) -> Result<Critical, CriticalError> {
    if !problem.has_exit() {
        return Err(CriticalError::NoExit);
    }
    let (mass, h) = (problem.mass, problem.exit_depth);
    let (kd, Stage { static_force: p, drag: q, .. }) = problem.crater_depth_and_tunnel();
    let energy = if h <= kd {
        match stiffness {
            // H = k d = 0 is 0/0 in either form: nothing to perforate.
            _ if h == 0.0 => 0.0,
            CraterStiffness::Continuous => 0.5 * h * h * p / (kd + q / mass * (kd - h) * (kd + h)),
            CraterStiffness::Given(c) => 0.5 * c * h * h,
        }
    } else {
        let beyond = h - kd;
        let at_crater_end = p * beyond * expm1_over(2.0 * q * beyond / mass);
        match stiffness {
            CraterStiffness::Continuous => at_crater_end * (1.0 + kd * q / mass) + 0.5 * kd * p,
            CraterStiffness::Given(c) => at_crater_end + 0.5 * c * kd * kd,
        }
    };
    Critical::new(mass, energy)
}

/// Critical velocity of stages with fixed coefficients and no viscosity; the impact speed of `problem` is not used.
///
/// Backwards from the exit, where nothing need be left, by `W(from) = e^y (W(to) + loss)` through each stage. A stage
/// that drives may demand less than nothing at its start; then its start is what must be reached, and the demand is
/// cut at zero (a barrier before it decides). Zero when every stage drives.
///
/// # Errors
/// [`CriticalError`].
pub fn critical_of_stages(problem: &Problem) -> Result<Critical, CriticalError> {
    if !problem.has_exit() {
        return Err(CriticalError::NoExit);
    }
    let mut demand = 0.0_f64;
    for (index, stage) in problem.stages.iter().enumerate().rev() {
        let (from, to) = (problem.start_of(index), problem.limit_of(index));
        if to <= from {
            continue;
        }
        if stage.viscosity > 0.0 {
            return Err(CriticalError::Viscous(index));
        }
        // W(to) = W(from) e^{-y} - loss, solved for W(from); cut before the exponential, which may be infinite.
        let loss = -propagate(stage, problem.mass, 0.0, from, to);
        let needed = demand + loss;
        // Not `needed > 0.0`, so that a NaN is not taken for no demand but refused below.
        demand = if needed <= 0.0 { 0.0 } else { needed * (2.0 * stage.drag * (to - from) / problem.mass).exp() };
    }
    Critical::new(problem.mass, 0.5 * problem.mass * demand)
}
