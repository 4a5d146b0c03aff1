//! One stage of resistance, and the list of stages that a scene resolves into.
//!
//! ```text
//! M dV/dt = -F(x, V),   F = p + s x + r V + q V²   until x = end
//! ```
//!
//! The crater (Eq. 4) is `s = c`; the tunnel (Eq. 5) is `p = P, q = Q`; weight or thrust is `p < 0`. Every
//! integrator, closed form and event works on a [`Problem`] and on nothing else, so a new resistance law is one
//! more way to make stages.

use smallvec::SmallVec;

use super::event::Outcome;
use super::scalar::Scalar;

/// Resistance `F = p + s x + r V + q V²` [N] until `x = end`; positive `F` slows the projectile.
///
/// Depth `x` counts from the impact face in every stage, not from the stage's own start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<S = f64> {
    /// Static force p [N], of any sign; negative drives the projectile.
    pub static_force: S,
    /// Stiffness s [N/m], not negative.
    pub stiffness: S,
    /// Viscosity r [kg/s], not negative.
    pub viscosity: S,
    /// Drag q [kg/m], not negative.
    pub drag: S,
    /// Depth where the stage ends [m], from the impact face; infinite when it does not end.
    pub end: S,
}

impl<S: Scalar> Stage<S> {
    /// The crater stage `F = c x` (Eq. 4) until `x = end`.
    pub fn crater(stiffness: S, end: S) -> Self {
        Self { static_force: S::zero(), stiffness, viscosity: S::zero(), drag: S::zero(), end }
    }

    /// The tunnel stage `F = P + Q V²` (Eq. 5), without an end.
    pub fn tunnel(static_force: S, drag: S) -> Self {
        Self { static_force, stiffness: S::zero(), viscosity: S::zero(), drag, end: S::from_f64(f64::INFINITY) }
    }

    /// Force [N] at depth `x` [m] and velocity `v` [m/s].
    ///
    /// Smooth for every argument: it is the law of this stage continued beyond its ends, never a branch on `x`.
    #[inline(always)]
    pub fn force(&self, x: S, v: S) -> S {
        self.static_force
            + self.stiffness * x
            + fault!("drag-sign", self.viscosity + self.drag * v, self.viscosity - self.drag * v) * v
    }

    /// Work of the static part `∫ (p + s x) dx` [J] from depth `from` to depth `to` [m].
    ///
    /// A lower bound of the energy that passage costs, whatever the velocity.
    #[inline]
    pub fn static_work(&self, from: S, to: S) -> S {
        let half = S::from_f64(0.5);
        (to - from) * (self.static_force + half * self.stiffness * (to + from))
    }

    /// Values as `f64`.
    pub fn values(&self) -> Stage {
        Stage {
            static_force: self.static_force.value(),
            stiffness: self.stiffness.value(),
            viscosity: self.viscosity.value(),
            drag: self.drag.value(),
            end: self.end.value(),
        }
    }

    /// Whether the stage can only slow the projectile (`p >= 0`); such a stage is never stiff.
    pub fn resists(&self) -> bool {
        self.static_force.value() >= 0.0
    }
}

/// Which target the stages came from: decides only how boundaries and stops are named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// One crater and one tunnel (a crater of no depth is left out).
    CraterAndTunnel,
    /// Stages given outright, or layers.
    Stages,
}

/// The stages of a problem in the order of their ends; two fit without an allocation.
pub type Stages<S = f64> = SmallVec<[Stage<S>; 2]>;

/// An initial value problem: `M x'' = -F(x, x')`, `x(0) = 0`, `x'(0) = V0`, until rest or the exit depth.
///
/// Invariants, kept by [`crate::physics::Scene::resolve`]: mass > 0; impact speed and exit depth >= 0; stage ends
/// do not fall; at least one stage; the last stage has no end. Everything is finite except absent ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem<S = f64> {
    /// Mass M [kg].
    pub mass: S,
    /// Impact speed V0 [m/s].
    pub impact_speed: S,
    /// Exit depth [m]; infinite for a semi-infinite target.
    pub exit_depth: S,
    /// The stages, in order.
    pub stages: Stages<S>,
    /// Index of the stage that ends at the crater's depth k d, if there is a crater.
    pub crater: Option<usize>,
    /// How boundaries and stops are named.
    pub target: Target,
}

impl<S: Scalar> Problem<S> {
    /// Whether the target has a far side.
    pub fn has_exit(&self) -> bool {
        self.exit_depth.value().is_finite()
    }

    /// Depth where stage `index` begins [m].
    pub fn start_of(&self, index: usize) -> S {
        if index == 0 { S::zero() } else { self.stages[index - 1].end }
    }

    /// Where a flight through stage `index` must stop to think: its end or the exit depth, whichever comes first [m].
    ///
    /// Infinite when there is neither.
    pub fn limit_of(&self, index: usize) -> S {
        let end = self.stages[index].end;
        if self.exit_depth.value() < end.value() { self.exit_depth } else { end }
    }

    /// Name of a stop in stage `index`.
    pub fn stop_in(&self, index: usize) -> Outcome {
        match (self.target, self.crater) {
            (Target::Stages, _) => Outcome::Stopped,
            (Target::CraterAndTunnel, Some(crater)) if index <= crater => Outcome::StoppedInCrater,
            (Target::CraterAndTunnel, _) => Outcome::StoppedInTunnel,
        }
    }

    /// The same problem in another number type, coefficients taken over by value.
    pub fn cast<T: Scalar>(&self) -> Problem<T> {
        let to = |v: S| T::from_f64(v.value());
        Problem {
            mass: to(self.mass),
            impact_speed: to(self.impact_speed),
            exit_depth: to(self.exit_depth),
            stages: self
                .stages
                .iter()
                .map(|s| Stage {
                    static_force: to(s.static_force),
                    stiffness: to(s.stiffness),
                    viscosity: to(s.viscosity),
                    drag: to(s.drag),
                    end: to(s.end),
                })
                .collect(),
            crater: self.crater,
            target: self.target,
        }
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
}
