//! Where, when and how fast, without integrating: the exact solution of a [`Problem`], stage by stage.
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
//! p, s, r (q = 0)    damped oscillation: xi(t) and V(t), rest at an elementary time; passing a depth is one scalar root
//! ```
//!
//! The form for `tau` is ours: it follows from `V0 - V = (2 xi/M) E(-y) (p + q V0²)/(V0 + V)`, and it needs no
//! difference of nearly equal speeds, holds for p of either sign and through p = 0, q = 0 and terminal velocity.
//! The crater (Eq. 4) is `s` alone, the tunnel (Eq. 5) `p, q`. Stages with r and q, or with s and q, have no form
//! here: of the latter the speed over depth is known ([`squared_speed_at`]), the time is not.
//!
//! Accuracy: depth, times and velocities (these relative to V0), critical velocity and energy stay within
//! 8 ulp x max(1, condition number) of the 50-digit reference ([`super::reference`]); the worst of 40,000 random
//! flights through crater and tunnel was 2.6.
//!
//! Source: Li & Chen (2003) for crater and tunnel; the others from the linear and separable equations above.

use smallvec::SmallVec;
use thiserror::Error;

use super::event::{Event, EventKind, Outcome, State};
use super::exit_energy::{carry, exit_margin, expm1_over, speed_missing};
use super::scene::CraterStiffness;
use super::stage::{Problem, Stage, Stages, Target};

/// The exact course of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// How it ended: by energy and depth, never `Undecided` (the bar below is for the caller to judge by).
    pub outcome: Outcome,
    /// Index from 0 of the stage in which it ended.
    pub stage: usize,
    /// State at the end: at rest `X, T, 0`; perforated: exit depth, time of exit, `V_r`.
    pub end: State,
    /// Events in time order; at one place stage ends, exit, rest.
    pub events: SmallVec<[Event; 4]>,
    /// Exit margin `W(exit)/V0²` ([`super::exit_energy`]); `None` without an exit depth or an impact speed.
    pub exit_margin: Option<f64>,
    /// Half-width of the round-off bar of the margin.
    pub exit_margin_error: Option<f64>,
}

/// Why there is no closed form, or no end of the flight.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ClosedFormError {
    /// A stage on the way has no solution in elementary functions.
    #[error("stage {stage} has no closed form: {why}")]
    NoForm {
        /// Index of the stage from 0.
        stage: usize,
        /// Which combination of coefficients stands in the way.
        why: &'static str,
    },
    /// Nothing stops the projectile and there is no far side, or both are only approached.
    #[error("the flight never ends: {why}; entered the last stage at {last}")]
    NeverEnds {
        /// What keeps it going.
        why: &'static str,
        /// State in which the endless stage was entered.
        last: State,
    },
    /// A quantity left the range of 64-bit numbers.
    #[error("the closed form of stage {stage} leaves the range of 64-bit numbers after {last}")]
    OutOfRange {
        /// Index of the stage from 0.
        stage: usize,
        /// Last state in range.
        last: State,
    },
}

/// Solves `problem` from impact to rest or exit.
///
/// Without an allocation for crater and tunnel. At one place: reaching a depth with no speed left is reaching it, so
/// `X = exit depth` is a perforation with `V_r = 0` and rest exactly at k d is a stop in the crater.
///
/// # Errors
/// [`ClosedFormError`]: a stage on the way has no closed form, the flight never ends, or a number is out of range.
///
/// # Example
/// ```
/// use penetrode::physics::{Outcome, Problem, Stage, Target, closed_form};
/// // 100 N against 1 kg at 10 m/s: V0²/(2 a) = 0.5 m in V0/a = 0.1 s.
/// let problem = Problem {
///     mass: 1.0,
///     impact_speed: 10.0,
///     exit_depth: f64::INFINITY,
///     stages: [Stage::tunnel(100.0, 0.0)].into_iter().collect(),
///     crater: None,
///     target: Target::CraterAndTunnel,
/// };
/// let solution = closed_form::solve(&problem)?;
/// assert_eq!(solution.outcome, Outcome::StoppedInTunnel);
/// assert_eq!((solution.end.depth, solution.end.time), (0.5, 0.1));
/// # Ok::<(), closed_form::ClosedFormError>(())
/// ```
pub fn solve(problem: &Problem) -> Result<Solution, ClosedFormError> {
    solve_with(problem, None)
}

/// Solves crater and tunnel from the numbers of the model, at `impact_speed` [m/s] and up to `exit_depth` [m].
///
/// The same flight as [`solve`] of the stages, with the speed in a continuous crater free of c:
///
/// ```text
/// V(x)² = (V0² (k d M + Q (k d - x)(k d + x)) - x² P)/(k d (M + k d Q))
/// ```
///
/// A rounded c costs V1 up to `sqrt(1 + k d Q/M)/4` ulps of V0 whatever is done with it: nothing for N above one, 14
/// ulps at N = 1e-3. This form has no such loss.
///
/// # Errors
/// As [`solve`].
pub fn solve_crater_and_tunnel(
    target: &CraterAndTunnel,
    impact_speed: f64,
    exit_depth: f64,
) -> Result<Solution, ClosedFormError> {
    solve_with(&target.problem(impact_speed, exit_depth), Some(target))
}

fn solve_with(problem: &Problem, model: Option<&CraterAndTunnel>) -> Result<Solution, ClosedFormError> {
    let mut events = SmallVec::new();
    let Arrival { stage, state: end, reached } = follow(problem, model, problem.exit_depth, Some(&mut events))?;
    let outcome = if reached { Outcome::Perforated } else { problem.stop_in(stage) };
    let margin = exit_margin(problem, outcome, stage, end, &events);
    Ok(Solution {
        outcome,
        stage,
        end,
        events,
        exit_margin: margin,
        exit_margin_error: margin.map(|margin| margin_bar(problem, stage, end.depth, margin)),
    })
}

/// The state in which the flight passes `depth` [m], rest there included; `None` where it never gets.
///
/// Depths beyond the exit depth are not reached. With [`solve`] this gives the path: V(x) and t(x).
///
/// # Errors
/// As [`solve`], for the stages up to `depth` only.
pub fn state_at(problem: &Problem, depth: f64) -> Result<Option<State>, ClosedFormError> {
    // `<=` and not `>`, so that a NaN is not reached either.
    if !(depth <= problem.exit_depth) {
        return Ok(None);
    }
    let arrival = follow(problem, None, depth, None)?;
    Ok((arrival.state.depth == depth).then_some(arrival.state))
}

/// `W = V²` [m²/s²] at `depth`, continued below zero beyond rest; `None` when a stage before `depth` has r > 0.
///
/// Unlike [`state_at`] it covers stages with stiffness and drag together.
pub fn squared_speed_at(problem: &Problem, depth: f64) -> Option<f64> {
    let mut w = problem.impact_speed * problem.impact_speed;
    let mut from = 0.0;
    for stage in &problem.stages {
        let to = stage.end.min(depth);
        if to > from {
            if stage.viscosity > 0.0 {
                return None;
            }
            w = carry(stage, problem.mass, w, from, to);
            from = to;
        }
        if stage.end >= depth {
            break;
        }
    }
    Some(w)
}

/// Where a flight arrived.
struct Arrival {
    stage: usize,
    state: State,
    /// Whether it got to the depth asked for.
    reached: bool,
}

/// Goes through the stages until rest or until depth `until`, and notes the events.
fn follow(
    problem: &Problem,
    model: Option<&CraterAndTunnel>,
    until: f64,
    mut events: Option<&mut SmallVec<[Event; 4]>>,
) -> Result<Arrival, ClosedFormError> {
    let mut note = |kind, state| {
        if let Some(events) = events.as_deref_mut() {
            events.push(Event { kind, state });
        }
    };
    let mut state = State::at_impact(problem);
    // The stage flown last, so that rest on a boundary counts to the stage before it; none yet at the face.
    let mut flown = None;
    for (index, stage) in problem.stages.iter().enumerate() {
        let limit = if until < stage.end { until } else { stage.end };
        if limit > state.depth {
            if state.velocity <= 0.0 {
                note(EventKind::Rest, state);
                return Ok(Arrival { stage: flown.unwrap_or(index), state, reached: false });
            }
            flown = Some(index);
            let entry = state;
            let leg = match model {
                Some(model) if problem.crater == Some(index) => model.crater_leg(stage, entry.velocity, limit),
                _ => leg(stage, problem.mass, entry, limit)
                    .map_err(|why| ClosedFormError::NoForm { stage: index, why })?,
            };
            let (kept_on, next) = match leg {
                Leg::Passes { time, velocity } => (true, State { time: entry.time + time, depth: limit, velocity }),
                Leg::Rests { time, way } => {
                    // The depth of rest and the speed at the limit round apart; the limit was not reached.
                    let depth = if entry.depth + way > limit { limit } else { entry.depth + way };
                    (false, State { time: entry.time + time, depth, velocity: 0.0 })
                }
                Leg::Endless(why) => {
                    // By less than what the bar of the margin leaves open of the speed: `2 V dV`.
                    let v0 = problem.impact_speed;
                    let bar = margin_bar(problem, index, entry.depth, 0.0) * v0 * v0;
                    let missing = speed_missing(stage, problem.mass, entry, limit);
                    if missing.is_none_or(|missing| 2.0 * entry.velocity * missing > bar) {
                        return Err(ClosedFormError::NeverEnds { why, last: entry });
                    }
                    let time = entry.time - f64::EPSILON.ln() * problem.mass / stage.viscosity;
                    (true, State { time, depth: limit, velocity: 0.0 })
                }
            };
            if !(next.time.is_finite() && next.depth.is_finite() && next.velocity.is_finite()) {
                return Err(ClosedFormError::OutOfRange { stage: index, last: entry });
            }
            state = next;
            if !kept_on {
                note(EventKind::Rest, state);
                return Ok(Arrival { stage: index, state, reached: false });
            }
        }
        if stage.end <= until {
            note(EventKind::boundary(problem, index), state);
        }
        // Every stage that ends at the exit is noted before it: the flight is over in the first that ends beyond.
        if until < stage.end {
            note(EventKind::Exit, state);
            if state.velocity <= 0.0 {
                note(EventKind::Rest, state);
            }
            return Ok(Arrival { stage: flown.unwrap_or(index), state, reached: true });
        }
    }
    // Only a list whose last stage ends gets here, which the invariants of a problem exclude.
    Err(ClosedFormError::NeverEnds { why: "the last stage ends and nothing follows", last: state })
}

/// How a stage is left.
enum Leg {
    /// At its limit, after `time` [s], with `velocity` [m/s].
    Passes { time: f64, velocity: f64 },
    /// Not at all: rest after `time` [s] and `way` [m].
    Rests { time: f64, way: f64 },
    /// Not at all, and without rest.
    Endless(&'static str),
}

/// One stage from `entry` (V > 0) to `limit` (beyond it, possibly infinite).
fn leg(stage: &Stage, mass: f64, entry: State, limit: f64) -> Result<Leg, &'static str> {
    match (stage.stiffness > 0.0, stage.viscosity > 0.0, stage.drag > 0.0) {
        (false, false, _) => Ok(drag_leg(stage, mass, entry, limit)),
        (true, false, false) => Ok(spring_leg(stage, mass, entry, limit)),
        (_, true, false) => Ok(viscous_leg(stage, mass, entry, limit)),
        (true, false, true) => Err("stiffness and drag together give the speed over depth but no elementary time"),
        (_, true, true) => Err("viscosity and drag act together"),
    }
}

/// `F = p + q V²`, p of any sign, q >= 0: the tunnel, constant force, drag alone, free flight.
#[inline]
fn drag_leg(stage: &Stage, mass: f64, entry: State, limit: f64) -> Leg {
    let (p, q, v0) = (stage.static_force, stage.drag, entry.velocity);
    let xi = limit - entry.depth;
    if limit.is_finite() {
        let decay = Decay::over(2.0 * q * xi / mass);
        let w = v0 * v0 * decay.end - 2.0 * p * xi / mass * decay.mean;
        if w >= 0.0 {
            // Without a static force w may underflow where its root does not.
            let v = if p == 0.0 { v0 * (-0.5 * decay.y).exp() } else { w.sqrt() };
            return Leg::Passes { time: drag_time(stage, mass, xi, &decay, v0, v), velocity: v };
        }
    }
    if p > 0.0 {
        let u = q * v0 * v0 / p;
        let tau = mass * v0 / p;
        // Below 1e-200 the logarithm equals u, and u may have lost its digits.
        let way = if u > 1e-200 { 0.5 * mass / q * fault!("depth-log1p", u.ln_1p(), u.ln()) } else { 0.5 * tau * v0 };
        return Leg::Rests { time: tau * atan_over(u.sqrt()), way };
    }
    Leg::Endless(match (p < 0.0, q > 0.0) {
        (true, _) => "the last stage drives the projectile",
        (false, true) => "drag alone never brings it to rest",
        (false, false) => "no force acts in the last stage",
    })
}

/// Time [s] from speed `v0` to `v` over the way `xi` under `p + q V²`.
fn drag_time(stage: &Stage, mass: f64, xi: f64, decay: &Decay, v0: f64, v: f64) -> f64 {
    let (p, q) = (stage.static_force, stage.drag);
    if p == 0.0 {
        // tau with V = V0 e^{-y/2}, freed of the exponentials that underflow: (xi/V0) E(y/2).
        return xi / v0 * expm1_over(0.5 * decay.y);
    }
    let tau = 2.0 * xi * decay.mean / (v + v0 * decay.end);
    if p > 0.0 {
        // Two roots: the product of small forces and drags underflows where the quotient by the mass does not.
        return tau * atan_over(fault!("tunnel-time", p.sqrt() * q.sqrt(), p.sqrt()) * tau / mass);
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

/// What is left of W after a way with `y = 2 q xi/M`, and on average over it.
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
            Self { y, end: 1.0 - lost, mean: fault!("decay-mean", lost / y, 1.0 - lost) }
        } else {
            // Below one half the exponential is subtracted from 1 without loss.
            let end = (-y).exp();
            Self { y, end, mean: (1.0 - end) / y }
        }
    }
}

/// `F = p + s x`, s > 0: the crater, and a spring that may be pulled first (p + s x < 0).
#[inline]
fn spring_leg(stage: &Stage, mass: f64, entry: State, limit: f64) -> Leg {
    let v0 = entry.velocity;
    let w = (stage.stiffness / mass).sqrt();
    let f0 = (stage.static_force + stage.stiffness * entry.depth) / mass;
    let xi = limit - entry.depth;
    if f0 == 0.0 {
        // The spring is entered where it is slack: the crater, and the hot path.
        return slack_spring_leg(w, v0, xi, (v0 - w * xi) * (v0 + w * xi));
    }
    if limit.is_finite() {
        let f = (stage.static_force + stage.stiffness * limit) / mass;
        let energy = v0 * v0 - xi * (f0 + f);
        if energy >= 0.0 {
            let v = energy.sqrt();
            // f V0 - f0 V; of the two terms the second is at worst minus half of the first.
            let crossed = xi * (w * w * v0 + f0 * ((f0 + f) / (v0 + v)));
            return Leg::Passes {
                time: (w * crossed).atan2(w * w * v * v0 + fault!("spring-time", f0, -f0) * f) / w,
                velocity: v,
            };
        }
    }
    let reach = f0.hypot(w * v0);
    let way = if f0 > 0.0 { v0 * (v0 / (f0 + reach)) } else { (reach - f0) / (w * w) };
    Leg::Rests { time: (w * v0).atan2(f0) / w, way }
}

/// A spring of frequency `w` from its slack end, with V² `squared_speed` at the way `xi`, continued below zero.
#[inline]
fn slack_spring_leg(w: f64, v0: f64, xi: f64, squared_speed: f64) -> Leg {
    if squared_speed >= 0.0 {
        let v = squared_speed.sqrt();
        Leg::Passes { time: fault!("atan2-swapped", (w * xi).atan2(v), v.atan2(w * xi)) / w, velocity: v }
    } else {
        Leg::Rests { time: fault!("half-period", std::f64::consts::FRAC_PI_2, std::f64::consts::PI) / w, way: v0 / w }
    }
}

/// `F = p + s x + r V`, r > 0: a damped oscillator, or drag in proportion to speed when s = 0.
///
/// Kept out of line: the hot path has no viscosity.
#[inline(never)]
fn viscous_leg(stage: &Stage, mass: f64, entry: State, limit: f64) -> Leg {
    let motion = Damped::new(stage, mass, entry);
    let way_to_limit = limit - entry.depth;
    if stage.static_force == 0.0 && stage.stiffness == 0.0 {
        // Viscosity alone: the speed falls by r/M for each metre.
        let lost = motion.fast * way_to_limit / motion.v0;
        return if lost < 1.0 {
            Leg::Passes { time: -(-lost).ln_1p() / motion.fast, velocity: motion.v0 * (1.0 - lost) }
        } else {
            Leg::Endless("viscosity alone never brings it to rest")
        };
    }
    let rest = motion.rest_time();
    if let Some(time) = rest {
        let (way, _) = motion.after(time);
        if way < way_to_limit {
            return Leg::Rests { time, way };
        }
    }
    if limit.is_infinite() {
        return Leg::Endless("its drive and its viscosity balance");
    }
    match motion.time_over(way_to_limit, rest) {
        Some(time) => Leg::Passes { time, velocity: motion.after(time).1.max(0.0) },
        None => Leg::Endless("it creeps towards a depth that it never reaches"),
    }
}

/// The linear motion `u'' + 2 g u' + w² u = 0`, `u = x + p/s`, from `u' = V0` and `w² u = f0`.
struct Damped {
    /// Speed at the start [m/s].
    v0: f64,
    /// Static deceleration at the start `f0 = (p + s x0)/M` [m/s²].
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
            slow: fault!("slow-rate", w2 / (g + m), g - m),
        }
    }

    /// Way [m] and speed [m/s] after time `t` [s].
    fn after(&self, t: f64) -> (f64, f64) {
        let Self { v0, f0, w2, g, m, .. } = *self;
        // 1 - e^(-gt) (cos + g sin) cancels where (g + w) t is small: so far in legs, each by its series.
        let turn = (g + w2.sqrt()) * t;
        if turn < 2.0 {
            let legs = (2.0 * turn).ceil().max(1.0);
            let (mut way, mut speed) = (0.0, v0);
            for _ in 0..legs as u32 {
                let (more, end) = self.series(speed, f0 + w2 * way, t / legs);
                (way, speed) = (way + more, end);
            }
            return (way, speed);
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

    /// Way [m] and speed [m/s] after time `t` [s], `(g + w) t` at most 1/2, by the Taylor series of u.
    ///
    /// 20 terms leave less than 1e-18 of the sum, and nothing cancels to first order.
    fn series(&self, v0: f64, f0: f64, t: f64) -> (f64, f64) {
        let Self { w2, g, .. } = *self;
        let (mut u1, mut u2) = (v0 * t, -0.5 * (2.0 * g * v0 + f0) * t * t);
        let (mut way, mut speed) = (u1 + u2, u1 + 2.0 * u2);
        for n in 1..20_u32 {
            let n = f64::from(n);
            let u3 = -(2.0 * g * t * (n + 1.0) * u2 + w2 * t * t * u1) / ((n + 2.0) * (n + 1.0));
            way += u3;
            speed += (n + 2.0) * u3;
            (u1, u2) = (u2, u3);
        }
        (way, speed / t)
    }

    /// Time until rest [s]; `None` when overdamped and driven so that it never rests.
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

    /// Time to cover `way` [m], which is reached before `rest` if there is one.
    ///
    /// Newton steps inside a bracket that only shrinks, halved where they would leave it. `None` when the way is
    /// only approached.
    fn time_over(&self, way: f64, rest: Option<f64>) -> Option<f64> {
        // It creeps towards the depth where spring and drive balance, and rounding would let it arrive.
        if rest.is_none() && self.w2 * way >= -self.f0 {
            return None;
        }
        let mut low = 0.0;
        let mut high = rest.unwrap_or(way / self.v0);
        let mut doublings = 0;
        while rest.is_none() && self.after(high).0 < way {
            high *= 2.0;
            doublings += 1;
            // 2^200 times the free-flight time: the motion has long settled.
            if doublings > 200 {
                return None;
            }
        }
        let mut t = (way / self.v0).min(high);
        for _ in 0..200 {
            let (covered, speed) = self.after(t);
            let excess = covered - way;
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

/// `atanh(z)/z`, 1 at zero.
fn atanh_over(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { z.atanh() / z }
}

/// Half-width of the round-off bar of the exit margin.
///
/// Every stage forms W from W at its start and the work done in it with at most eight roundings, each of half an
/// epsilon of the larger of the two: `e^{-y}` counts three of them however large y is, as `y e^{-y} < 1`. A depth of
/// rest off by two epsilons shifts the margin by that part of `2 |F| X/(M V0²)`. Both are within eight epsilons of
///
/// ```text
/// 1 + |margin| + sum over stages flown of (2/(M V0²)) (|p| b + s b²/2),   b = min(end, depth of the end)
/// ```
///
/// for each stage on the way to the exit.
fn margin_bar(problem: &Problem, stage: usize, depth: f64, margin: f64) -> f64 {
    let v0 = problem.impact_speed;
    let mut size = 1.0 + margin.abs();
    for law in &problem.stages[..=stage] {
        let way = if law.end < depth { law.end } else { depth };
        size += 2.0 * (law.static_force.abs() + 0.5 * law.stiffness * way) * way / problem.mass / v0 / v0;
    }
    let on_the_way = problem.stages.iter().take_while(|law| law.end < problem.exit_depth).count() + 1;
    8.0 * f64::EPSILON * size * on_the_way as f64
}

/// Crater and tunnel as the model gives them, before an impact speed turns them into stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraterAndTunnel {
    /// Projectile mass M [kg], above zero.
    pub mass: f64,
    /// Crater depth k d [m]; zero for none.
    pub crater_depth: f64,
    /// Static force of the tunnel P [N].
    pub static_force: f64,
    /// Drag of the tunnel Q [kg/m].
    pub drag: f64,
    /// How the crater constant c is chosen.
    pub crater_stiffness: CraterStiffness,
}

impl CraterAndTunnel {
    /// Crater constant c [N/m] at impact speed `impact_speed` [m/s]; zero without a crater.
    pub fn stiffness(&self, impact_speed: f64) -> f64 {
        let Self { mass, crater_depth: kd, static_force: p, drag: q, crater_stiffness } = *self;
        match crater_stiffness {
            CraterStiffness::Given(stiffness) => stiffness,
            CraterStiffness::Continuous if kd > 0.0 => {
                (p + q * impact_speed * impact_speed) / kd * (mass / (mass + kd * q))
            }
            CraterStiffness::Continuous => 0.0,
        }
    }

    /// The stages at `impact_speed` [m/s], up to `exit_depth` [m].
    pub fn problem(&self, impact_speed: f64, exit_depth: f64) -> Problem {
        let mut stages = Stages::new();
        let crater = (self.crater_depth > 0.0).then_some(0);
        if crater.is_some() {
            stages.push(Stage::crater(self.stiffness(impact_speed), self.crater_depth));
        }
        stages.push(Stage::tunnel(self.static_force, self.drag));
        Problem { mass: self.mass, impact_speed, exit_depth, stages, crater, target: Target::CraterAndTunnel }
    }

    /// The crater from the face to `limit`.
    fn crater_leg(&self, stage: &Stage, v0: f64, limit: f64) -> Leg {
        let Self { mass, crater_depth: kd, static_force: p, drag: q, crater_stiffness } = *self;
        let w = (stage.stiffness / mass).sqrt();
        let squared_speed = match crater_stiffness {
            CraterStiffness::Given(_) => (v0 - w * limit) * (v0 + w * limit),
            CraterStiffness::Continuous => {
                (v0 * v0 * (kd * mass + fault!("crater-speed", q, -q) * (kd - limit) * (kd + limit))
                    - limit * limit * p)
                    / (kd * (mass + kd * q))
            }
        };
        slack_spring_leg(w, v0, limit, squared_speed)
    }
}

/// The impact speed that just perforates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Critical {
    /// Critical velocity `V_c` [m/s].
    pub velocity: f64,
    /// Critical energy `E_c = M V_c²/2` [J].
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
    #[error("stage {stage} is viscous: the critical velocity has no closed form")]
    Viscous {
        /// Index of the stage from 0.
        stage: usize,
    },
}

/// Critical velocity of crater and tunnel: the impact speed with `X = exit_depth`.
///
/// ```text
/// continuous c, H <= k d :  E_c = H² P/(2 (k d + (Q/M) (k d - H)(k d + H)))
/// continuous c, H >  k d :  E_c = E1c (1 + k d Q/M) + k d P/2,   E1c = P (H - k d) E(2 Q (H - k d)/M)
/// c given                :  E_c = c H²/2                  and    E_c = E1c + c (k d)²/2
/// ```
///
/// with `E(z) = expm1(z)/z` and `V_c² = 2 E_c/M`: theory section 2 in energies, which keep their range longer. The
/// continuous c depends on the impact speed, which is why this is not the critical velocity of any one [`Problem`].
///
/// # Errors
/// [`CriticalError::NoExit`] for an infinite `exit_depth` [m], [`CriticalError::OutOfRange`] beyond 1e308 J.
pub fn critical(target: &CraterAndTunnel, exit_depth: f64) -> Result<Critical, CriticalError> {
    let CraterAndTunnel { mass, crater_depth: kd, static_force: p, drag: q, crater_stiffness } = *target;
    if exit_depth.is_infinite() {
        return Err(CriticalError::NoExit);
    }
    let h = exit_depth;
    if h <= kd {
        return Critical::new(
            mass,
            match crater_stiffness {
                // H = k d = 0 is 0/0 in either form: nothing to perforate.
                _ if h == 0.0 => 0.0,
                CraterStiffness::Continuous => {
                    0.5 * h * h * p / (kd + fault!("critical-in-crater", q, 0.0) / mass * (kd - h) * (kd + h))
                }
                CraterStiffness::Given(c) => 0.5 * c * h * h,
            },
        );
    }
    let beyond = h - kd;
    let at_crater_end = p * beyond * expm1_over(2.0 * q * beyond / mass);
    Critical::new(
        mass,
        match crater_stiffness {
            CraterStiffness::Continuous => {
                at_crater_end * (1.0 + fault!("critical-drag", kd * q / mass, 0.0))
                    + fault!("critical-half", 0.5, 1.0) * kd * p
            }
            CraterStiffness::Given(c) => at_crater_end + 0.5 * c * kd * kd,
        },
    )
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
            return Err(CriticalError::Viscous { stage: index });
        }
        // W(to) = W(from) e^{-y} - loss, solved for W(from); cut before the exponential, which may be infinite.
        let loss = -carry(stage, problem.mass, 0.0, from, to);
        let needed = demand + loss;
        // Not `needed > 0.0`, so that a NaN is not taken for no demand but refused below.
        demand = if needed <= 0.0 { 0.0 } else { needed * (2.0 * stage.drag * (to - from) / problem.mass).exp() };
    }
    Critical::new(problem.mass, 0.5 * problem.mass * demand)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]
    use super::*;
    use crate::physics::reference::{self, Conditions, Exact, ExactFlight, Source};
    use crate::physics::scene::{Concrete, Criterion, Resistance, Scene};
    use std::f64::consts::PI;

    /// Allowed error in ulps over max(1, condition): measured 2.6 when every error is divided so, 20,000 scenes.
    const LIMIT: f64 = 8.0;

    /// Random cases of a test: all of them where the big floats are compiled with optimization.
    const CASES: u32 = if cfg!(debug_assertions) { 1_000 } else { 20_000 };

    /// A generator of our own for the scenes, `SplitMix64` (Steele, Lea, Flood 2014), the same on every machine.
    struct Dice(u64);

    impl Dice {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
        }

        fn log(&mut self, low: f64, high: f64) -> f64 {
            (low.ln() + self.unit() * (high / low).ln()).exp()
        }

        fn one_in(&mut self, n: u32) -> bool {
            self.unit() * f64::from(n) < 1.0
        }
    }

    /// The model's constants at rounding accuracy, as the resolution of a scene computes them.
    fn model_of(scene: &Scene) -> CraterAndTunnel {
        let Resistance::Concrete(concrete) = &scene.resistance else { unreachable!("only concrete is rolled") };
        let area = 0.25 * PI * concrete.diameter * concrete.diameter;
        CraterAndTunnel {
            mass: scene.mass,
            crater_depth: concrete.crater_ratio * concrete.diameter,
            static_force: area * concrete.static_factor * concrete.strength,
            drag: area * concrete.nose_factor * concrete.inertia_factor * concrete.density,
            crater_stiffness: concrete.crater_stiffness,
        }
    }

    /// A random scene: I 1e-9 to 1e6, N 1e-3 to 1e12, micrometres to kilometres, with and without a far side, crater,
    /// drag; a third of them within 1e-1 to 1e-12 of their critical velocity or of rest at k d.
    fn roll(dice: &mut Dice) -> (Scene, f64) {
        let d = dice.log(1e-6, 1e2);
        let (strength, static_factor, density) = (dice.log(1e5, 1e9), dice.log(1.0, 30.0), dice.log(1e2, 1e4));
        let (nose_factor, inertia_factor) =
            (if dice.one_in(10) { 0.0 } else { dice.log(0.01, 1.0) }, dice.log(0.5, 1.5));
        let n = dice.log(1e-3, 1e12);
        let mass = n * density * d * d * d * if nose_factor > 0.0 { nose_factor * inertia_factor } else { 1.0 };
        let k = if dice.one_in(12) { 0.0 } else { dice.log(0.1, 5.0) };
        let force = static_factor * strength;
        let i = dice.log(1e-9, 1e6);
        let thickness = if dice.one_in(3) { None } else { Some(d * dice.log(0.01, 100.0)) };
        let stiffness = if dice.one_in(3) {
            CraterStiffness::Given(force * d / k.max(0.1) * dice.log(0.05, 20.0))
        } else {
            CraterStiffness::Continuous
        };
        let scene = Scene {
            title: None,
            mass,
            resistance: Resistance::Concrete(Concrete {
                diameter: d,
                nose_factor,
                strength,
                density,
                static_factor,
                inertia_factor,
                crater_ratio: k,
                crater_stiffness: stiffness,
                layers: Vec::new(),
            }),
            thickness,
            criterion: Criterion::FullDepth,
            velocity: None,
        };
        let mut speed = (i * force * d * d * d / mass).sqrt();
        if dice.one_in(3) {
            let model = model_of(&scene);
            let to = if dice.one_in(2) { thickness.unwrap_or(model.crater_depth) } else { model.crater_depth };
            let off = dice.log(1e-12, 1e-1) * if dice.one_in(2) { -1.0 } else { 1.0 };
            if let Ok(critical) = critical(&model, to)
                && critical.velocity > 0.0
                && critical.velocity < 1e100
            {
                speed = critical.velocity * (1.0 + off);
            }
        }
        (scene, speed)
    }

    /// Errors in ulps of the exact value (of V0 for velocities).
    #[derive(Debug, Default)]
    struct Errors {
        depth: f64,
        time: f64,
        velocity: f64,
        crater_end_time: f64,
        crater_end_velocity: f64,
    }

    fn ulp(value: f64) -> f64 {
        value.next_up() - value
    }

    fn ulps(exact: &Exact, value: f64) -> f64 {
        let near = exact.to_f64();
        if near == 0.0 {
            if value == 0.0 { 0.0 } else { f64::INFINITY }
        } else {
            exact.relative_error(value) * near / ulp(near)
        }
    }

    fn ulps_of(exact: &Exact, value: f64, scale: &Exact) -> f64 {
        let near = scale.to_f64();
        exact.error_over(value, scale) * near / ulp(near)
    }

    fn errors(solution: &Solution, exact: &ExactFlight) -> Errors {
        let mut errors = Errors {
            depth: ulps(&exact.end.depth, solution.end.depth),
            time: ulps(&exact.end.time, solution.end.time),
            velocity: ulps_of(&exact.end.velocity, solution.end.velocity, &exact.impact_speed),
            ..Errors::default()
        };
        if let (Some(exact_end), Some(end)) =
            (exact.crater_end(), solution.events.iter().find(|e| e.kind == EventKind::CraterEnd))
        {
            errors.crater_end_time = ulps(&exact_end.time, end.state.time);
            errors.crater_end_velocity = ulps_of(&exact_end.velocity, end.state.velocity, &exact.impact_speed);
        }
        errors
    }

    /// Each error over max(1, condition); the condition is asked for only where an error is above `limit`.
    fn conditioned(errors: Errors, limit: f64, conditions: impl FnOnce() -> Conditions) -> Errors {
        let Errors { depth, time, velocity, crater_end_time, crater_end_velocity } = errors;
        if [depth, time, velocity, crater_end_time, crater_end_velocity].iter().all(|e| *e <= limit) {
            return errors;
        }
        let by = conditions();
        Errors {
            depth: depth / by.depth.max(1.0),
            time: time / by.time.max(1.0),
            velocity: velocity / by.velocity.max(1.0),
            crater_end_time: crater_end_time / by.crater_end_time.unwrap_or(1.0).max(1.0),
            crater_end_velocity: crater_end_velocity / by.crater_end_velocity.unwrap_or(1.0).max(1.0),
        }
    }

    impl Errors {
        fn worsen(&mut self, other: &Self) {
            self.depth = self.depth.max(other.depth);
            self.time = self.time.max(other.time);
            self.velocity = self.velocity.max(other.velocity);
            self.crater_end_time = self.crater_end_time.max(other.crater_end_time);
            self.crater_end_velocity = self.crater_end_velocity.max(other.crater_end_velocity);
        }

        fn worst(&self) -> f64 {
            [self.depth, self.time, self.velocity, self.crater_end_time, self.crater_end_velocity]
                .into_iter()
                .fold(0.0, f64::max)
        }
    }

    /// Compares `count` random scenes and gives the worst errors, flight and critical velocity.
    fn compare(seed: u64, count: u32) -> (Errors, f64) {
        let mut dice = Dice(seed);
        let (mut worst, mut worst_critical) = (Errors::default(), 0.0_f64);
        let mut undecidable = 0;
        for case in 0..count {
            let (scene, speed) = roll(&mut dice);
            let source = Source::Scene(&scene, speed);
            let exact = reference::flight(source).unwrap();
            let exit_depth = scene.thickness.unwrap_or(f64::INFINITY);
            let solution = solve_crater_and_tunnel(&model_of(&scene), speed, exit_depth).unwrap();
            if let (Some(margin), Some(bar), Some(exact)) =
                (solution.exit_margin, solution.exit_margin_error, &exact.exit_margin)
            {
                let off = (margin - exact.to_f64()).abs();
                // The bar is that of the problem; resolving the scene adds the errors of its coefficients.
                assert!(off <= 2.0 * bar, "case {case}: margin {margin:e} is off by {off:e}, bar {bar:e}\n{scene:?}");
                if margin.abs() <= bar {
                    undecidable += 1;
                    continue;
                }
            }
            assert!(solution.outcome.agrees_with(exact.outcome), "case {case}: {solution:?}\n{exact:?}\n{scene:?}");
            // Rest within round-off of k d may name its stage either way.
            if solution.outcome == exact.outcome {
                let errors = conditioned(errors(&solution, &exact), LIMIT, || reference::conditions(source).unwrap());
                assert!(errors.worst() <= LIMIT, "case {case}: {errors:?}\n{solution:?}\n{scene:?} V0 = {speed:e}");
                worst.worsen(&errors);
            }
            let Some(thickness) = scene.thickness else { continue };
            let exact = reference::critical(source).unwrap();
            match critical(&model_of(&scene), thickness) {
                Ok(critical) => {
                    let mut error = ulps(&exact.velocity, critical.velocity).max(ulps(&exact.energy, critical.energy));
                    if error > LIMIT {
                        // That of the energy is larger: twice it, and one for the mass.
                        error /= reference::critical_condition(source).unwrap().max(1.0);
                    }
                    assert!(error <= LIMIT, "case {case}: V_c {critical:?} off by {error} ulp\n{scene:?}");
                    worst_critical = worst_critical.max(error);
                }
                Err(error) => {
                    assert_eq!(error, CriticalError::OutOfRange);
                    assert!(exact.energy.to_f64() > 1e300, "case {case}: E_c = {}", exact.energy.to_decimal(5));
                }
            }
        }
        assert!(f64::from(undecidable) < 0.05 * f64::from(count), "{undecidable} of {count} inside the bar");
        (worst, worst_critical)
    }

    #[test]
    fn flights_of_random_scenes_are_within_8_ulp_times_condition_of_50_digits() {
        let (worst, worst_critical) = compare(1, CASES);
        println!("worst, in ulps over max(1, condition): {worst:?}, V_c and E_c {worst_critical}");
    }

    /// A random list of one to four stages of every family that has a form, resisting and driving, with and without
    /// a far side; forces up to a thousand times what stops the projectile within its stage, and down to nothing.
    fn roll_stages(dice: &mut Dice) -> Problem {
        let (mass, length, speed) = (dice.log(1e-3, 1e3), dice.log(1e-3, 1e1), dice.log(1e-1, 1e3));
        let energy = mass * speed * speed;
        // Half of them alone, so that drives are not all behind a stop.
        let count = if dice.one_in(2) { 1 } else { 2 + (dice.unit() * 3.0) as usize };
        let mut stages = Stages::new();
        let mut end = 0.0;
        for index in 0..count {
            let family = (dice.unit() * 8.0) as u32;
            let sign = if dice.one_in(3) { -1.0 } else { 1.0 };
            let p = sign * energy / length * dice.log(1e-4, 1e3);
            let s = energy / length / length * dice.log(1e-4, 1e3);
            let r = mass * speed / length * dice.log(1e-4, 1e3);
            let q = mass / length * dice.log(1e-4, 1e4);
            let (p, s, r, q) = match family {
                0 => (p, 0.0, 0.0, 0.0),
                1 => (p, s, 0.0, 0.0),
                2 => (p, 0.0, 0.0, q),
                3 => (p, 0.0, r, 0.0),
                4 => (p, s, r, 0.0),
                5 => (0.0, 0.0, r, 0.0),
                // Drag alone: exit times grow as e^{y/2} and soon leave the range.
                6 => (0.0, 0.0, 0.0, q.min(1e1 * mass / length)),
                _ => (0.0, 0.0, 0.0, 0.0),
            };
            end += length * dice.log(1e-3, 3.0);
            let end = if index + 1 == count { f64::INFINITY } else { end };
            stages.push(Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end });
        }
        let exit_depth = if dice.one_in(4) { f64::INFINITY } else { length * dice.log(0.01, 10.0) };
        Problem { mass, impact_speed: speed, exit_depth, stages, crater: None, target: Target::Stages }
    }

    /// Compares flights with the reference; counts those that stop, that perforate, and that never end.
    fn compare_stages(problems: impl Iterator<Item = Problem>) -> [u32; 3] {
        let (mut worst, mut ended) = (Errors::default(), [0; 3]);
        for (case, problem) in problems.enumerate() {
            let source = Source::Problem(&problem);
            let (solution, exact) = match (solve(&problem), reference::flight(source)) {
                (Ok(solution), Ok(exact)) => (solution, exact),
                (Err(ClosedFormError::NeverEnds { .. }), Err(reference::ReferenceError::NeverEnds)) => {
                    ended[2] += 1;
                    continue;
                }
                (solution, exact) => panic!("case {case}: {solution:?}\n{exact:?}\n{problem:?}"),
            };
            assert_eq!(solution.outcome, exact.outcome, "case {case}: {solution:?}\n{exact:?}\n{problem:?}");
            assert_eq!(solution.stage, exact.stage);
            ended[usize::from(solution.outcome == Outcome::Perforated)] += 1;
            let kinds = solution.events.iter().map(|e| e.kind);
            assert!(kinds.eq(exact.events.iter().map(|e| e.kind)), "case {case}");
            let errors = conditioned(errors(&solution, &exact), LIMIT, || reference::conditions(source).unwrap());
            assert!(errors.worst() <= LIMIT, "case {case}: {errors:?}\n{solution:?}\n{problem:?}");
            worst.worsen(&errors);
            if let (Some(margin), Some(bar), Some(exact)) =
                (solution.exit_margin, solution.exit_margin_error, &exact.exit_margin)
            {
                let off = exact.error_over(margin, &reference::Exact::one());
                assert!(
                    off <= bar,
                    "case {case}: margin {margin:e} is off by {off:e}, bar {bar:e}\n{solution:?}\n{problem:?}"
                );
            }
        }
        println!("worst, in ulps over max(1, condition): {worst:?}");
        ended
    }

    /// Springs and dashpots about critical damping, where differences of rates vanish, pushed and pulled, from hardly
    /// any speed to much; left close before and behind rest, where the speed is none for Newton's method to divide by.
    #[test]
    fn oscillators_about_critical_damping_are_within_8_ulp_times_condition_of_50_digits() {
        let mut dice = Dice(6);
        let mut problems = Vec::new();
        for off in [0.0, 1e-12, -1e-12, 1e-8, 1e-5, -1e-5, 1e-3, -1e-3, 2e-2, 0.1] {
            for _ in 0..CASES / 50 {
                // The frequency a whole number and M = 1: critical damping is met exactly.
                let w = dice.log(1.0, 10.0).floor();
                let speed = dice.log(1e-6, 1e2);
                let pull = dice.log(1e-3, 1e3) * if dice.one_in(3) { 1.0 } else { -1.0 };
                let oscillator =
                    Stage { stiffness: w * w, viscosity: 2.0 * w * (1.0 + off), ..Stage::tunnel(pull, 0.0) };
                let mut endless = problem(&[oscillator], 1.0, speed, f64::INFINITY);
                endless.crater = None;
                endless.target = Target::Stages;
                let reach = solve(&endless).map_or(-pull / (w * w), |solution| solution.end.depth);
                let part = dice.log(1e-3, 1.0);
                let exit_depth = reach * if dice.one_in(2) { part } else { 1.0 - 1e-3 * part };
                problems.push(endless.clone());
                problems.push(Problem { exit_depth, ..endless });
            }
        }
        let [stopped, perforated, endless] = compare_stages(problems.into_iter());
        assert!(stopped > 20 && perforated > 20 && endless > 20, "{stopped}, {perforated}, {endless}");
    }

    #[test]
    fn flights_through_stages_of_every_family_are_within_8_ulp_times_condition_of_50_digits() {
        let mut dice = Dice(2);
        let ended = compare_stages((0..CASES).map(|_| roll_stages(&mut dice)));
        assert!(ended.iter().all(|n| 10 * n > CASES), "stopped, perforated, endless: {ended:?}");
    }

    #[test]
    fn critical_velocity_of_stages_is_within_8_ulp_times_condition_of_50_digits() {
        let mut dice = Dice(3);
        let (mut worst, mut zero, mut done) = (0.0_f64, 0, 0);
        while done < CASES {
            let mut problem = roll_stages(&mut dice);
            for stage in &mut problem.stages {
                // Stiffness with drag among them, which has V(x) and therefore a critical velocity.
                stage.drag += stage.viscosity * problem.impact_speed.recip();
                stage.viscosity = 0.0;
            }
            let source = Source::Problem(&problem);
            if !problem.has_exit() {
                assert_eq!(critical_of_stages(&problem), Err(CriticalError::NoExit));
                continue;
            }
            done += 1;
            let exact = reference::critical(source).unwrap();
            let Ok(critical) = critical_of_stages(&problem) else {
                assert!(exact.energy.to_f64() > 1e290, "{exact:?}");
                continue;
            };
            if critical.velocity == 0.0 {
                zero += 1;
            }
            let mut error = ulps(&exact.velocity, critical.velocity);
            if error > LIMIT {
                error /= reference::critical_condition(source).unwrap().max(1.0);
            }
            assert!(error <= LIMIT, "{error} ulp\n{problem:?}\n{critical:?} {}", exact.velocity.to_decimal(20));
            worst = worst.max(error);
        }
        println!("worst, in ulps over max(1, condition): {worst}; driven throughout: {zero}");
        assert!(zero > 0);
    }

    /// Li & Chen's dimensionless depth, from I, N and k: unit diameter, density and strength.
    fn dimensionless_depth(i: f64, n: f64, k: f64) -> f64 {
        let target = CraterAndTunnel {
            mass: n,
            crater_depth: k,
            static_force: 0.25 * PI,
            drag: 0.25 * PI,
            crater_stiffness: CraterStiffness::Continuous,
        };
        solve_crater_and_tunnel(&target, (i / n).sqrt(), f64::INFINITY).unwrap().end.depth
    }

    #[test]
    fn dimensionless_depths_are_the_published_ones() {
        for (i, n, k, depth) in [
            (0.5, 10.0, 2.0, 1.184_519_008_163_294_5),
            (2.0, 10.0, 2.0, 2.231_871_462_056_812_7),
            (100.0, 10.0, 2.0, 16.336_651_809_520_088),
            (0.2, 20.0, 0.707, 0.428_021_653_964_986_66),
            (50.0, 234.3, 2.365, 30.038_836_818_523_704),
            // Forrestal 1994 shot 14 with the published groups: 6.21.
            (8.455, 125.9, 2.0, 6.215_773_173_665_595),
        ] {
            let computed = dimensionless_depth(i, n, k);
            assert!((computed / depth - 1.0).abs() < 8.0 * f64::EPSILON, "{computed} for {depth}");
        }
    }

    #[test]
    fn dimensionless_critical_energies_are_those_of_the_table() {
        // E_c/(d³ fc S) at k = 2 by Li & Chen (2003): H/d, N, value.
        for (thickness, n, energy) in [
            (1.0, 5.0, 0.158_907_777_799_397_2),
            (2.0, 20.0, 0.25 * PI),
            (10.0, 100.0, 7.585_602_604_876_231),
            (18.0, 5.0, 498.214_509_251_034_6),
        ] {
            let target = CraterAndTunnel {
                mass: n,
                crater_depth: 2.0,
                static_force: 0.25 * PI,
                drag: 0.25 * PI,
                crater_stiffness: CraterStiffness::Continuous,
            };
            let computed = critical(&target, thickness).unwrap().energy;
            assert!((computed / energy - 1.0).abs() < 2e-15, "{computed} for {energy}");
        }
    }

    fn problem(stages: &[Stage], mass: f64, impact_speed: f64, exit_depth: f64) -> Problem {
        Problem {
            mass,
            impact_speed,
            exit_depth,
            stages: stages.iter().copied().collect(),
            crater: Some(0),
            target: Target::CraterAndTunnel,
        }
    }

    fn kinds(solution: &Solution) -> Vec<EventKind> {
        solution.events.iter().map(|e| e.kind).collect()
    }

    #[test]
    fn rest_at_the_crater_end_is_a_stop_in_the_crater_and_rest_at_the_exit_a_perforation() {
        // w = V0 = 10: the spring is stopped at x = 1 to the last bit.
        let stages = [Stage::crater(100.0, 1.0), Stage::tunnel(100.0, 1.0)];
        let stopped = solve(&problem(&stages, 1.0, 10.0, 2.0)).unwrap();
        assert_eq!((stopped.outcome, stopped.stage), (Outcome::StoppedInCrater, 0));
        assert_eq!(kinds(&stopped), [EventKind::CraterEnd, EventKind::Rest]);
        let through = solve(&problem(&stages, 1.0, 10.0, 1.0)).unwrap();
        assert_eq!((through.outcome, through.stage, through.end.velocity), (Outcome::Perforated, 0, 0.0));
        assert_eq!(kinds(&through), [EventKind::CraterEnd, EventKind::Exit, EventKind::Rest]);
        assert_eq!(through.exit_margin, Some(0.0));
        let viscous = [Stage { stiffness: 3.0, viscosity: 1.0, ..Stage::tunnel(7.0, 0.0) }];
        let rest = solve(&problem(&viscous, 1.0, 10.0, f64::INFINITY)).unwrap().end.depth;
        assert_eq!(solve(&problem(&viscous, 1.0, 10.0, rest)).unwrap().outcome, Outcome::Perforated);
        // Nor does a drive behind the boundary start what has come to rest.
        let driven = [Stage::crater(100.0, 1.0), Stage::tunnel(-100.0, 0.0)];
        assert_eq!(solve(&problem(&driven, 1.0, 10.0, 2.0)).unwrap().outcome, Outcome::StoppedInCrater);
    }

    #[test]
    fn every_stage_end_at_one_place_is_an_event_once_and_before_the_exit() {
        let end = |end| Stage { end, ..Stage::tunnel(1.0, 0.0) };
        let stages = [end(0.0), end(1.0), end(1.0), end(2.0), end(2.0), Stage::tunnel(1.0, 0.0)];
        let mut several = problem(&stages, 1.0, 10.0, 2.0);
        several.crater = Some(1);
        let solution = solve(&several).unwrap();
        assert_eq!(
            kinds(&solution),
            [
                EventKind::StageEnd(0),
                EventKind::CraterEnd,
                EventKind::StageEnd(2),
                EventKind::StageEnd(3),
                EventKind::StageEnd(4),
                EventKind::Exit
            ]
        );
        assert_eq!(solution.stage, 3);
    }

    #[test]
    fn at_rest_or_without_a_target_the_flight_is_over_at_impact() {
        let stages = [Stage::crater(100.0, 1.0), Stage::tunnel(-100.0, 1.0)];
        let still = solve(&problem(&stages, 1.0, 0.0, 2.0)).unwrap();
        assert_eq!(
            (still.outcome, kinds(&still), still.exit_margin),
            (Outcome::StoppedInCrater, vec![EventKind::Rest], None)
        );
        let bare = solve(&problem(&stages, 1.0, 3.0, 0.0)).unwrap();
        assert_eq!((bare.outcome, bare.end.velocity, kinds(&bare)), (Outcome::Perforated, 3.0, vec![EventKind::Exit]));
    }

    #[test]
    fn the_path_keeps_the_energy_and_ends_where_the_flight_ends() {
        let stages = [
            Stage { end: 0.1, ..Stage::crater(8e6, 0.1) },
            Stage { end: 0.2, ..Stage::tunnel(-3e5, 2.0) },
            Stage { stiffness: 1e5, end: 0.3, ..Stage::tunnel(1e5, 0.0) },
            Stage::tunnel(2e5, 3.0),
        ];
        let scene = problem(&stages, 2.0, 300.0, f64::INFINITY);
        let solution = solve(&scene).unwrap();
        let mut before = State::at_impact(&scene);
        for step in 1..=1000 {
            let depth = solution.end.depth * f64::from(step) / 1000.0;
            let state = state_at(&scene, depth).unwrap().unwrap();
            let w = squared_speed_at(&scene, depth).unwrap();
            assert!((state.velocity * state.velocity - w).abs() < 1e-15 * 9e4 * 20.0, "{state} against {w}");
            // The mean speed of a short step lies between the speeds at its ends, but for rounding.
            let mean = (state.depth - before.depth) / (state.time - before.time);
            let (slow, fast) = (before.velocity.min(state.velocity), before.velocity.max(state.velocity));
            // A driven stage that begins inside the step may raise the speed between.
            assert!(mean > slow * 0.98 && mean < fast * 1.02, "{before} to {state}");
            before = state;
        }
        assert_eq!(state_at(&scene, solution.end.depth).unwrap(), Some(solution.end));
        assert_eq!(state_at(&scene, solution.end.depth.next_up()).unwrap(), None);
        assert_eq!(state_at(&scene, 0.0).unwrap(), Some(State::at_impact(&scene)));
        for nowhere in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(state_at(&scene, nowhere).unwrap(), None);
        }
        let thin = Problem { exit_depth: 0.15, ..scene };
        assert!(state_at(&thin, 0.15).unwrap().is_some());
        assert_eq!(state_at(&thin, 0.16).unwrap(), None);
    }

    #[test]
    fn without_a_crater_there_is_no_stage_for_it_and_no_stiffness() {
        let target = CraterAndTunnel {
            mass: 1.0,
            crater_depth: 0.0,
            static_force: 1.0,
            drag: 1.0,
            crater_stiffness: CraterStiffness::Continuous,
        };
        assert_eq!(target.stiffness(10.0), 0.0);
        let problem = target.problem(10.0, 1.0);
        assert_eq!((problem.stages.len(), problem.crater), (1, None));
        assert_eq!(critical(&target, 0.0).map(|critical| critical.energy), Ok(0.0));
    }

    #[test]
    fn a_viscous_stage_hides_the_speed_behind_its_start_only() {
        let stages = [Stage { viscosity: 1.0, ..Stage::tunnel(1.0, 0.0) }];
        assert_eq!(squared_speed_at(&problem(&stages, 1.0, 3.0, 2.0), 0.0), Some(9.0));
        assert_eq!(squared_speed_at(&problem(&stages, 1.0, 3.0, 2.0), 1e-9), None);
    }

    #[test]
    fn the_bar_of_the_margin_is_eight_epsilons_of_its_sum() {
        // M V0²/2 = 9e4 J. The crater's spring over 0.1 m, and 1e5 N over the whole depth: 0.25 m, or that of rest.
        let stages = [Stage::crater(4e6, 0.1), Stage::tunnel(-1e5, 2.0)];
        for (exit_depth, on_the_way) in [(0.25, 2.0), (0.1, 1.0)] {
            let solution = solve(&problem(&stages, 2.0, 300.0, exit_depth)).unwrap();
            let tunnel = if exit_depth > 0.1 { 1e5 * exit_depth } else { 0.0 };
            let sum = 1.0 + solution.exit_margin.unwrap() + (0.5 * 4e6 * 0.01 + tunnel) / 9e4;
            let bar = solution.exit_margin_error.unwrap() / (8.0 * f64::EPSILON * on_the_way);
            assert!((bar / sum - 1.0).abs() < 1e-14, "{bar} for {sum}");
        }
    }

    #[test]
    fn an_endless_flight_and_a_stage_without_a_form_are_named() {
        for (stage, why) in [
            (Stage::tunnel(0.0, 0.0), "no force acts in the last stage"),
            (Stage::tunnel(0.0, 1.0), "drag alone never brings it to rest"),
            (Stage::tunnel(-1.0, 1.0), "the last stage drives the projectile"),
            (Stage { viscosity: 1.0, ..Stage::tunnel(0.0, 0.0) }, "viscosity alone never brings it to rest"),
            (Stage { viscosity: 1.0, ..Stage::tunnel(-1.0, 0.0) }, "its drive and its viscosity balance"),
        ] {
            let error = solve(&problem(&[stage], 1.0, 10.0, f64::INFINITY)).unwrap_err();
            assert_eq!(
                error,
                ClosedFormError::NeverEnds { why, last: State { time: 0.0, depth: 0.0, velocity: 10.0 } }
            );
        }
        // The stiff scene creeps towards |p|/s = 10: it leaves at 9 and would never reach 10.
        let stiff = Stage { static_force: -1000.0, stiffness: 100.0, viscosity: 1000.0, drag: 0.0, end: f64::INFINITY };
        assert_eq!(solve(&problem(&[stiff], 1.0, 1.0, 9.0)).unwrap().outcome, Outcome::Perforated);
        assert!(matches!(solve(&problem(&[stiff], 1.0, 1.0, 10.0)), Err(ClosedFormError::NeverEnds { .. })));
        // Critical damping, and a drive that V0 just balances: x = 10 (1 - e^-t).
        let critical = Stage { stiffness: 1.0, viscosity: 2.0, ..Stage::tunnel(-10.0, 0.0) };
        let half = solve(&problem(&[critical], 1.0, 10.0, 5.0)).unwrap().end;
        let off = [half.time / std::f64::consts::LN_2 - 1.0, half.velocity / 5.0 - 1.0];
        assert!(off.iter().all(|off| off.abs() < 1e-15), "{half}");
        assert!(matches!(solve(&problem(&[critical], 1.0, 10.0, 20.0)), Err(ClosedFormError::NeverEnds { .. })));
        let both = Stage { viscosity: 1.0, ..Stage::tunnel(1.0, 1.0) };
        let error = solve(&problem(&[Stage::crater(1.0, 1.0), both], 1.0, 10.0, 3.0)).unwrap_err();
        assert_eq!(error.to_string(), "stage 1 has no closed form: viscosity and drag act together");
        // V0 = r x/M: the whole speed is lost just before the exit. And a drive that V0 just balances: the motion is the
        // fast decay alone, x = 1 - e^(-2 t).
        let lost = Stage { viscosity: 1.0, ..Stage::tunnel(0.0, 0.0) };
        let balanced = Stage { stiffness: 1.0, viscosity: 2.5, ..Stage::tunnel(-1.0, 0.0) };
        for (stage, speed, exit_depth) in [(lost, 10.0, 10.0 + 1.1e-14), (balanced, 2.0, 1.5)] {
            let error = solve(&problem(&[stage], 1.0, speed, exit_depth)).unwrap_err();
            assert!(matches!(error, ClosedFormError::NeverEnds { .. }), "{error}");
        }
        // At the exit and not before: there without speed, and the margin within its bar.
        for exit_depth in [10.0, 10.0 + 4e-15] {
            let within = solve(&problem(&[lost], 1.0, 10.0, exit_depth)).unwrap();
            assert_eq!((within.end.depth, within.exit_margin), (exit_depth, Some(0.0)));
        }
        // Until the speed is an epsilon of what it was, M/r ln(1/eps), here behind a gap that takes 0.1 s.
        let (gap, slowing) = (Stage { end: 1.0, ..Stage::tunnel(0.0, 0.0) }, Stage { viscosity: 4.0, ..lost });
        let within = solve(&problem(&[gap, slowing], 2.0, 10.0, 6.0)).unwrap().end;
        assert!((within.time / (0.1 + 0.5 * 36.043_653_389_117_15) - 1.0).abs() < 1e-15, "{within}");
        // It stands in the way only of a flight that gets there.
        assert!(solve(&problem(&[Stage::crater(1e3, 1.0), both], 1.0, 10.0, 3.0)).is_ok());
    }

    #[test]
    fn a_number_out_of_range_is_an_error_and_not_an_infinity() {
        let heavy = solve(&problem(&[Stage::tunnel(1e-300, 0.0)], 1e300, 1e100, f64::INFINITY));
        assert!(matches!(heavy, Err(ClosedFormError::OutOfRange { stage: 0, .. })), "{heavy:?}");
        // Drag alone over a thousand drag lengths: e^1000 s.
        let late = solve(&problem(&[Stage::tunnel(0.0, 1.0)], 1.0, 10.0, 1000.0));
        assert!(matches!(late, Err(ClosedFormError::OutOfRange { stage: 0, .. })), "{late:?}");
        let target = CraterAndTunnel {
            mass: 1.0,
            crater_depth: 0.0,
            static_force: 1.0,
            drag: 1.0,
            crater_stiffness: CraterStiffness::Continuous,
        };
        assert_eq!(critical(&target, 400.0), Err(CriticalError::OutOfRange));
        assert_eq!(critical(&target, f64::INFINITY), Err(CriticalError::NoExit));
        assert!(critical(&target, 340.0).is_ok());
        // 1e-8 kg and 1e302 J: V_c² = 2e310 is out of range, V_c is not.
        let light = CraterAndTunnel { mass: 1e-8, static_force: 1e302, drag: 0.0, ..target };
        assert!((critical(&light, 1.0).unwrap().velocity / (2.0_f64.sqrt() * 1e155) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_barrier_before_a_drive_decides_the_critical_velocity() {
        // 2 kg: 0.1 m of 1 MN cost 1e5 J; the drive behind gives more than the last metre takes.
        let stages = [
            Stage { end: 0.1, ..Stage::tunnel(1e6, 0.0) },
            Stage { end: 0.5, ..Stage::tunnel(-1e6, 0.0) },
            Stage::tunnel(1e5, 0.0),
        ];
        let critical = critical_of_stages(&problem(&stages, 2.0, 1.0, 1.5)).unwrap();
        assert!((critical.energy / 1e5 - 1.0).abs() < 4.0 * f64::EPSILON);
        let viscous = [Stage { viscosity: 1.0, ..stages[2] }];
        assert_eq!(critical_of_stages(&problem(&viscous, 2.0, 1.0, 1.5)), Err(CriticalError::Viscous { stage: 0 }));
    }

    #[test]
    fn within_round_off_of_the_exit_a_stop_is_not_deeper_than_the_exit() {
        let mut dice = Dice(4);
        let (mut stops, mut at_exit) = (0, 0);
        for _ in 0..200 {
            let stages = [Stage::tunnel(dice.log(1e4, 1e6), dice.log(1e-2, 1e2))];
            let exit_depth = dice.log(0.01, 1.0);
            let critical = critical_of_stages(&problem(&stages, 2.0, 1.0, exit_depth)).unwrap().velocity;
            let mut speed = critical;
            for _ in 0..10 {
                let solution = solve(&problem(&stages, 2.0, speed, exit_depth)).unwrap();
                assert!(solution.end.depth <= exit_depth, "{solution:?}");
                stops += u32::from(solution.outcome.is_stop());
                at_exit += u32::from(solution.outcome.is_stop() && solution.end.depth == exit_depth);
                speed = speed.next_down();
            }
        }
        assert!(stops > 100 && at_exit > 0, "{stops} stops, {at_exit} of them at the exit but for rounding");
    }

    #[test]
    fn speed_over_depth_with_stiffness_and_drag_is_that_of_the_reference() {
        let mut dice = Dice(5);
        let mut worst = 0.0_f64;
        for case in 0..6 {
            let (p, s, q) = (dice.log(1e-2, 1e1), dice.log(1e-2, 1e1), dice.log(1e-6, 1e1));
            let stage = Stage { stiffness: s, ..Stage::tunnel(if dice.one_in(2) { p } else { -p }, q) };
            // The reference takes the time of each by quadrature, which is slow: few cases.
            let scene = problem(&[stage], 1.0, 3.0, dice.log(1e-3, 1e-1));
            let source = Source::Problem(&scene);
            let Ok(exact) = reference::flight(source) else { panic!("case {case}: {scene:?}") };
            assert_eq!(exact.outcome, Outcome::Perforated);
            let w = squared_speed_at(&scene, scene.exit_depth).unwrap();
            worst = worst.max(ulps_of(&exact.end.velocity, w.sqrt(), &exact.impact_speed));
        }
        assert!(worst <= LIMIT, "{worst} ulps of V0");
    }
}
