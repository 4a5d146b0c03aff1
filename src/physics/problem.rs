//! The initial value problem that every method solves, and what its solution consists of: states, events, outcome.
//!
//! ```text
//! M dV/dt = -F(x, V),  dx/dt = V,  x(0) = 0,  V(0) = V0,   F = p + s x + r V + q V²   until x = end
//! ```
//!
//! The crater (Eq. 4) is `s = c`; the tunnel (Eq. 5) is `p = P, q = Q`; weight or thrust is `p < 0`. Every
//! integrator, closed form and event works on a [`Problem`] and on nothing else, so a new resistance law is one
//! more way to make stages.
//!
//! How an integrator finds an event is described in [`crate::integrators::locate`].

use serde::{Deserialize, Deserializer, Serialize};
use smallvec::SmallVec;

use super::law::{Law, Laws};
use super::scalar::Scalar;
use crate::text::Shown;

/// Resistance `F = p + s x + r V + q V²` (N) until `x = end`; positive `F` slows the projectile.
///
/// Depth `x` counts from the impact face in every stage, not from the stage's own start.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(bound(deserialize = "S: Scalar + Deserialize<'de>"))]
pub struct Stage<S = f64> {
    /// Static force p (N), of any sign; negative drives the projectile.
    #[serde(rename = "static_force_n")]
    #[cfg_attr(feature = "report", schemars(with = "Option<S>"))]
    pub static_force: S,
    /// Stiffness s (N/m). Negative only without viscosity and drag, and only where the force does not fall through zero
    /// inside the stage: it is a piece of a table then ([`super::force_table`]).
    #[serde(rename = "stiffness_n_m")]
    #[cfg_attr(feature = "report", schemars(with = "Option<S>"))]
    pub stiffness: S,
    /// Viscosity r (kg/s), not negative.
    #[serde(rename = "viscosity_kg_s")]
    #[cfg_attr(feature = "report", schemars(with = "Option<S>"))]
    pub viscosity: S,
    /// Drag q (kg/m), not negative.
    #[serde(rename = "drag_kg_m")]
    #[cfg_attr(feature = "report", schemars(with = "Option<S>"))]
    pub drag: S,
    /// Depth where the stage ends (m), from the impact face; infinite, `null` in JSON, when it does not end.
    #[serde(rename = "end_m", deserialize_with = "infinite_if_null")]
    #[cfg_attr(feature = "report", schemars(with = "Option<S>"))]
    pub end: S,
}

/// Two stages with a law of their own, whose coefficients are NaN, are the same.
impl<S: PartialEq> PartialEq for Stage<S> {
    #[expect(clippy::eq_op, reason = "NaN")]
    fn eq(&self, other: &Self) -> bool {
        let is_same = |a: &S, b: &S| a == b || (a != a && b != b);
        let Self { static_force, stiffness, viscosity, drag, end } = self;
        is_same(static_force, &other.static_force)
            && is_same(stiffness, &other.stiffness)
            && is_same(viscosity, &other.viscosity)
            && is_same(drag, &other.drag)
            && is_same(end, &other.end)
    }
}

fn infinite_if_null<'de, S: Scalar + Deserialize<'de>, D: Deserializer<'de>>(depth: D) -> Result<S, D::Error> {
    Ok(Option::deserialize(depth)?.unwrap_or(S::from_f64(f64::INFINITY)))
}

impl<S: Scalar> Stage<S> {
    /// The crater stage `F = c x` (Eq. 4) until `x = end`.
    pub fn crater(stiffness: S, end: S) -> Self {
        Self { stiffness, end, ..Self::free() }
    }

    /// The crater stage until `depth` = k d in front of `beyond`, with a force that is continuous there.
    ///
    /// ```text
    /// c = M (P + Q V0²)/(k d (M + k d Q)),  divided through by M
    /// ```
    pub fn continuous_crater(depth: S, beyond: &Self, mass: S, impact_speed: S) -> Self {
        let force = beyond.static_force + beyond.drag * impact_speed * impact_speed;
        Self::crater(force / (S::one() + depth * (beyond.drag / mass)) / depth, depth)
    }

    /// The tunnel stage `F = P + Q V²` (Eq. 5), without an end.
    pub fn tunnel(static_force: S, drag: S) -> Self {
        Self { static_force, drag, ..Self::free() }
    }

    /// A stage without force and without an end.
    pub fn free() -> Self {
        let zero = S::zero();
        Self { static_force: zero, stiffness: zero, viscosity: zero, drag: zero, end: S::from_f64(f64::INFINITY) }
    }

    /// A stage until x = `end` (m) whose force is a [`Law`] of its own.
    ///
    /// Its coefficients are NaN: what reads them in place of the law gets no number, and no wrong one.
    pub fn of_law(end: S) -> Self {
        let none = S::from_f64(f64::NAN);
        Self { static_force: none, stiffness: none, viscosity: none, drag: none, end }
    }

    /// The same stage until x = `end` (m).
    #[must_use]
    pub fn until(mut self, end: S) -> Self {
        self.end = end;
        self
    }

    /// Force (N) at depth `x` (m) and velocity `v` (m/s).
    ///
    /// Smooth for every argument: the law of this stage continued beyond its ends, without a branch on `x`.
    #[inline(always)]
    pub fn force(&self, x: S, v: S) -> S {
        self.static_force + self.stiffness * x + (self.viscosity + self.drag * v) * v
    }

    /// Work of the static part `∫ (p + s x) dx` (J) from depth `from` to depth `to` (m).
    ///
    /// A lower bound of the energy lost on this path, at any velocity.
    #[inline]
    pub fn static_work(&self, from: S, to: S) -> S {
        let half = S::from_f64(0.5);
        (to - from) * (self.static_force + half * self.stiffness * (to + from))
    }

    /// `to` of each of its numbers.
    #[inline(always)]
    pub fn map<T>(&self, mut to: impl FnMut(S) -> T) -> Stage<T> {
        Stage {
            static_force: to(self.static_force),
            stiffness: to(self.stiffness),
            viscosity: to(self.viscosity),
            drag: to(self.drag),
            end: to(self.end),
        }
    }

    /// Values as `f64`.
    pub fn values(&self) -> Stage {
        self.map(S::value)
    }

    /// The law divided by `mass`: its [`Stage::force`] is the deceleration (m/s²).
    #[inline(always)]
    #[must_use]
    pub fn per_mass(&self, mass: S) -> Self {
        Self { end: self.end, ..self.map(|coefficient| coefficient.over(mass)) }
    }

    /// Whether the stage can only slow the projectile wherever it is (`p, s >= 0`); such a stage is never stiff.
    pub fn resists(&self) -> bool {
        self.static_force.value() >= 0.0 && self.stiffness.value() >= 0.0
    }

    /// Whether the static part of the force does not drive the projectile between the depths `from` and `to` (m).
    pub fn resists_between(&self, from: S, to: S) -> bool {
        let at_rest = |x: S| (self.static_force + self.stiffness * x).value();
        self.resists() || (at_rest(from) >= 0.0 && at_rest(to) >= 0.0)
    }
}

/// Which target the stages came from: decides only how boundaries and stops are named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// One crater and one tunnel (a crater of no depth is left out).
    CraterAndTunnel,
    /// Stages given directly, or layers.
    Stages,
    /// As `Stages`, without an exit; the last one, without force and end, stands for what lies behind the last row of a
    /// table. A flight that gets there ends with an error, for no force is known there.
    StagesToEndOfTable,
}

/// The stages of a problem in the order of their ends; two fit without an allocation.
pub type Stages<S = f64> = SmallVec<[Stage<S>; 2]>;

/// An initial value problem: `M x'' = -F(x, x')`, `x(0) = 0`, `x'(0) = V0`, until rest or the exit depth.
///
/// [`Scene::resolve`](crate::physics::Scene::resolve) makes one from a scene, [`Problem::of_stages`] and
/// [`Problem::crater_and_tunnel`] from numbers.
///
/// Invariants: mass > 0; impact speed and exit depth >= 0; stage ends do not fall; at least one stage; the last stage
/// has no end; where a stiffness is negative, viscosity and drag are zero, the stage has a limit, and the force keeps its
/// sign on the way to it. Everything is finite except absent ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem<S = f64> {
    /// Mass M (kg).
    pub mass: S,
    /// Impact speed V0 (m/s).
    pub impact_speed: S,
    /// Exit depth (m); infinite for a semi-infinite target.
    pub exit_depth: S,
    /// The stages, in order.
    pub stages: Stages<S>,
    /// Index of the stage that ends at the crater's depth k d, if there is a crater.
    pub crater: Option<usize>,
    /// How boundaries and stops are named.
    pub target: Target,
    /// The laws of the stages whose force is an expression.
    pub laws: Laws<S>,
}

impl<S> Problem<S> {
    /// Name of a stop in stage `index`.
    pub fn stop_in(&self, index: usize) -> Outcome {
        match (self.target, self.crater) {
            (Target::Stages | Target::StagesToEndOfTable, _) => Outcome::Stopped,
            (Target::CraterAndTunnel, Some(crater)) if index <= crater => Outcome::StoppedInCrater,
            (Target::CraterAndTunnel, _) => Outcome::StoppedInTunnel,
        }
    }
}

impl<S: Scalar> Problem<S> {
    /// A projectile of `mass` (kg) that enters `stages` at `impact_speed` (m/s); no exit depth.
    ///
    /// # Panics
    /// If an invariant of [`Problem`] is broken.
    pub fn of_stages(mass: S, impact_speed: S, stages: impl IntoIterator<Item = Stage<S>>) -> Self {
        let stages: Stages<S> = stages.into_iter().collect();
        let exit_depth = S::from_f64(f64::INFINITY);
        assert!(mass.value() > 0.0, "the mass is {} kg", mass.value());
        assert!(impact_speed.value() >= 0.0, "the impact speed is {} m/s", impact_speed.value());
        for (index, pair) in stages.windows(2).enumerate() {
            let ordered = pair[0].end.value() <= pair[1].end.value();
            assert!(ordered, "stage {} ends before the stage in front of it", index + 1);
        }
        assert!(stages.last().is_some_and(|last| last.end.value() == f64::INFINITY), "the last stage has an end");
        for (index, law) in stages.iter().enumerate().filter(|(_, law)| law.stiffness.value() < 0.0) {
            let is_static = law.viscosity.value() == 0.0 && law.drag.value() == 0.0;
            assert!(is_static, "stage {index} has viscosity or drag beside a force that falls with depth");
            let start = if index > 0 { stages[index - 1].end.value() } else { 0.0 };
            let [from, to] = [start, law.end.value()].map(|x| law.static_force.value() + law.stiffness.value() * x);
            // Where the stage ends at the zero of the force, round-off is left of it.
            let rounding = 4.0 * f64::EPSILON * law.static_force.value().abs();
            let keeps_sign = from <= rounding || to >= -rounding || law.end.value() == f64::INFINITY;
            assert!(keeps_sign, "the force of stage {index} falls through zero: end a stage there");
        }
        Self { mass, impact_speed, exit_depth, stages, crater: None, target: Target::Stages, laws: Laws::none() }
    }

    /// As [`Problem::of_stages`], through a crater, if there is one, and a tunnel.
    ///
    /// # Panics
    /// If an invariant of [`Problem`] is broken.
    pub fn crater_and_tunnel(mass: S, impact_speed: S, crater: Option<Stage<S>>, tunnel: Stage<S>) -> Self {
        let stages = crater.into_iter().chain([tunnel]);
        let target = Target::CraterAndTunnel;
        Self { crater: crater.map(|_| 0), target, ..Self::of_stages(mass, impact_speed, stages) }
    }

    /// As [`Problem::crater_and_tunnel`], through a crater to `depth` = k d (m) with the continuous constant c.
    ///
    /// # Panics
    /// If an invariant of [`Problem`] is broken.
    pub fn continuous(mass: S, impact_speed: S, depth: S, tunnel: Stage<S>) -> Self {
        let crater = Stage::continuous_crater(depth, &tunnel, mass, impact_speed);
        Self::crater_and_tunnel(mass, impact_speed, Some(crater), tunnel)
    }

    /// The same problem with a far side at `exit_depth` (m).
    #[must_use]
    pub fn with_exit(mut self, exit_depth: S) -> Self {
        self.exit_depth = exit_depth;
        self
    }

    /// The same problem with the force of stage `index` by a law of its own. Of the stage, its end alone counts then.
    ///
    /// # Panics
    /// If there is no such stage.
    #[must_use]
    pub fn with_law(mut self, index: usize, law: &Law<S>) -> Self {
        let lost = S::from_f64(f64::NAN);
        let end = self.stages[index].end;
        self.stages[index] = Stage { static_force: lost, stiffness: lost, viscosity: lost, drag: lost, end };
        self.laws = self.laws.with(index, law);
        self
    }

    /// Whether the target has a far side.
    pub fn has_exit(&self) -> bool {
        self.exit_depth.value().is_finite()
    }

    /// Depth (m) where the crater ends, zero without one, and the stage behind it.
    pub fn crater_depth_and_tunnel(&self) -> (S, Stage<S>) {
        self.crater.map_or((S::zero(), self.stages[0]), |crater| (self.stages[crater].end, self.stages[crater + 1]))
    }

    /// Depth where stage `index` begins (m): the end in front of it that is a place.
    pub fn start_of(&self, index: usize) -> S {
        let places = self.stages[..index].iter().rev().map(|stage| stage.end);
        places.into_iter().find(|end| end.value() < f64::INFINITY).unwrap_or(S::zero())
    }

    /// Depth (m) at which integration through stage `index` ends: its end or the exit depth, whichever comes first.
    ///
    /// Infinite when there is neither.
    pub fn limit_of(&self, index: usize) -> S {
        self.limit_in(&self.stages[index])
    }

    /// The same of a `stage`.
    #[inline(always)]
    pub(crate) fn limit_in(&self, stage: &Stage<S>) -> S {
        if self.exit_depth.value() < stage.end.value() { self.exit_depth } else { stage.end }
    }

    /// The same problem in another number type, coefficients taken over by value.
    pub fn cast<T: Scalar>(&self) -> Problem<T> {
        let to = |v: S| T::from_f64(v.value());
        Problem {
            mass: to(self.mass),
            impact_speed: to(self.impact_speed),
            exit_depth: to(self.exit_depth),
            stages: self.stages.iter().map(|stage| stage.map(to)).collect(),
            crater: self.crater,
            target: self.target,
            laws: self.laws.cast(),
        }
    }

    /// Stage `index` itself; where it has a law of its own, coefficients with the force of the law `at` a state and with its
    /// slopes there, `s = F_x` and `r = F_V`, as far as they are not negative.
    pub(crate) fn linear(&self, index: usize, at: State<S>) -> Stage<S> {
        let Some(law) = self.laws.of(index) else { return self.stages[index] };
        let number = |value: f64| S::from_f64(if value.is_finite() { value } else { 0.0 });
        let (by_depth, by_velocity) = law.slopes(at.depth.value(), at.velocity.value());
        let (stiffness, viscosity) = (number(by_depth.max(0.0)), number(by_velocity.max(0.0)));
        let force = number(law.force(at.depth, at.velocity).value());
        let static_force = force - stiffness * at.depth - viscosity * at.velocity;
        Stage { static_force, stiffness, viscosity, drag: S::zero(), end: self.stages[index].end }
    }

    /// Force (N) of stage `index` at depth `x` (m) and velocity `v` (m/s): that of its coefficients or of its law.
    #[inline(always)]
    pub fn force(&self, index: usize, x: S, v: S) -> S {
        match self.laws.of(index) {
            None => self.stages[index].force(x, v),
            Some(law) => law.force(x, v),
        }
    }
}

/// Time, depth and velocity at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct State<S = f64> {
    /// Time since impact t (s).
    #[serde(rename = "time_s")]
    pub time: S,
    /// Depth x from the impact face (m).
    #[serde(rename = "depth_m")]
    pub depth: S,
    /// Velocity V (m/s), not negative.
    #[serde(rename = "velocity_m_s")]
    pub velocity: S,
}

impl<S: Scalar> State<S> {
    /// The state at impact: `t = 0, x = 0, V = V0`.
    pub fn at_impact(problem: &Problem<S>) -> Self {
        Self { time: S::zero(), depth: S::zero(), velocity: problem.impact_speed }
    }

    /// Whether all three are numbers.
    #[inline(always)]
    pub fn is_finite(&self) -> bool {
        self.time.value().is_finite() && self.depth.value().is_finite() && self.velocity.value().is_finite()
    }

    /// The state with these values in another number type.
    pub fn cast<T: Scalar>(&self) -> State<T> {
        let State { time, depth, velocity } = self.values();
        State { time: T::from_f64(time), depth: T::from_f64(depth), velocity: T::from_f64(velocity) }
    }

    /// Values as `f64`.
    pub fn values(&self) -> State {
        State { time: self.time.value(), depth: self.depth.value(), velocity: self.velocity.value() }
    }
}

impl std::fmt::Display for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (time, depth, velocity) = (Shown(self.time), Shown(self.depth), Shown(self.velocity));
        write!(f, "t = {time} s, x = {depth} m, V = {velocity} m/s")
    }
}

/// Where and how the solution through one stage ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StageEnd<S = f64> {
    /// At the limit of the stage; the velocity there may be zero.
    Limit(State<S>),
    /// Before the limit, where the condition of the stage is met.
    Condition(State<S>),
    /// At rest before the limit.
    Rest(State<S>),
    /// Neither: from the state given, a place before the limit is only approached.
    Approach(State<S>, &'static str),
}

impl<S> StageEnd<S> {
    /// The state there.
    pub(crate) fn state(self) -> State<S> {
        let (Self::Limit(state) | Self::Condition(state) | Self::Rest(state) | Self::Approach(state, _)) = self;
        state
    }
}

/// What happened at a place. The order of the variants is the order of events at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, strum::IntoStaticStr)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(tag = "event", content = "stage", rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum EventKind {
    /// End of stage `.0` (index from 0) that is not the crater's.
    StageEnd(usize),
    /// Depth k d reached, touching included.
    CraterEnd,
    /// A plug breaks off ([`super::plug`]).
    Plug,
    /// Exit depth reached, touching included.
    Exit,
    /// Velocity zero.
    Rest,
}

/// A solver may say of every event in which stage it happened, and must of a `stage-end`.
impl<'de> Deserialize<'de> for EventKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(tag = "event", rename_all = "kebab-case")]
        enum Named {
            StageEnd { stage: usize },
            CraterEnd,
            Plug,
            Exit,
            Rest,
        }
        Ok(match Named::deserialize(deserializer)? {
            Named::StageEnd { stage } => Self::StageEnd(stage),
            Named::CraterEnd => Self::CraterEnd,
            Named::Plug => Self::Plug,
            Named::Exit => Self::Exit,
            Named::Rest => Self::Rest,
        })
    }
}

impl EventKind {
    /// The event at the end of stage `index` of `problem`.
    pub fn boundary<S>(problem: &Problem<S>, index: usize) -> Self {
        if problem.crater == Some(index) { Self::CraterEnd } else { Self::StageEnd(index) }
    }

    /// Name in every output (docs/reference.md, "JSON"): `crater-end`, `stage-end`, `plug`, `exit`, `rest`.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// An event and the state in which it happened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Event<S = f64> {
    /// What happened.
    #[serde(flatten)]
    pub kind: EventKind,
    /// When, where and how fast.
    #[serde(flatten)]
    pub state: State<S>,
}

/// How a solution ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, strum::Display, strum::IntoStaticStr)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Outcome {
    /// Rest at x <= k d.
    StoppedInCrater,
    /// Rest beyond k d, before the exit depth.
    StoppedInTunnel,
    /// Rest in a target of stages or layers, before the exit depth.
    Stopped,
    /// The exit depth was reached, with or without velocity left.
    Perforated,
    /// The exit margin lies inside its error bound: this method cannot decide.
    Undecided,
}

impl Outcome {
    /// Name in every output (docs/reference.md, "JSON").
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether the projectile came to rest inside the target.
    pub fn is_stop(self) -> bool {
        matches!(self, Self::StoppedInCrater | Self::StoppedInTunnel | Self::Stopped)
    }

    /// True for equal outcomes and for two stops: near k d, round-off decides the stage of a stop.
    pub fn agrees_with(self, other: Self) -> bool {
        self == other || (self.is_stop() && other.is_stop())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_resists_unless_its_static_force_drives() {
        let resists = |static_force: f64| Stage::tunnel(static_force, 1.0).resists();
        assert!(resists(1.0) && resists(0.0) && !resists(-1e-9));
    }

    #[test]
    fn states_and_outcomes_are_shown_by_their_numbers_with_units_and_their_names() {
        let state = State { time: 0.5, depth: 0.25, velocity: 100.0 };
        assert_eq!(state.to_string(), "t = 0.5 s, x = 0.25 m, V = 100 m/s");
        assert_eq!(Outcome::StoppedInCrater.to_string(), "stopped-in-crater");
    }

    #[test]
    fn constructors_name_the_target_and_leave_the_exit_open() {
        let tunnel = Stage::tunnel(100.0, 2.0);
        let staged = Problem::of_stages(2.0, 300.0, [tunnel.until(0.5), tunnel]);
        assert_eq!((staged.target, staged.crater, staged.has_exit()), (Target::Stages, None, false));
        assert_eq!(staged.with_exit(0.7).limit_of(1), 0.7);
        let crater = Problem::crater_and_tunnel(2.0, 300.0, Some(Stage::crater(5.0, 0.1)), tunnel);
        assert_eq!((crater.target, crater.crater, crater.stages.len()), (Target::CraterAndTunnel, Some(0), 2));
        assert_eq!(Problem::crater_and_tunnel(2.0, 300.0, None, tunnel).crater, None);
        // Energy over the crater: M V1² = M V0² - c (k d)².
        let continuous = Problem::continuous(2.0, 300.0, 0.1, tunnel);
        let c = continuous.stages[0].stiffness;
        let v1 = (300.0_f64.powi(2) - c * 0.01 / 2.0).sqrt();
        approx::assert_relative_eq!(c * 0.1, tunnel.force(0.1, v1), max_relative = 1e-14);
    }

    #[test]
    #[should_panic(expected = "the force of stage 0 falls through zero")]
    fn a_force_that_falls_through_zero_inside_a_stage_is_refused() {
        let falling = Stage { stiffness: -10.0, ..Stage::tunnel(2.0, 0.0) };
        Problem::of_stages(1.0, 1.0, [falling.until(0.3), Stage::tunnel(1.0, 0.0)]);
    }

    #[test]
    #[should_panic(expected = "stage 1 ends before the stage in front of it")]
    fn stages_out_of_order_are_no_problem() {
        let _ = Problem::of_stages(1.0, 1.0, [Stage::free().until(0.5), Stage::free().until(0.4), Stage::free()]);
    }
}
