//! What can happen on a flight, in which order at one place, and how it ends.
//!
//! This is what physics says about an event. How an integrator finds it is [`crate::integrators::locate`].

use super::number::Shown;
use super::scalar::Scalar;
use super::stage::Problem;

/// Time, depth and velocity at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<S = f64> {
    /// Time since impact t [s].
    pub time: S,
    /// Depth x from the impact face [m].
    pub depth: S,
    /// Velocity V [m/s], not negative.
    pub velocity: S,
}

impl<S: Scalar> State<S> {
    /// The state at impact: `t = 0, x = 0, V = V0`.
    pub fn at_impact(problem: &Problem<S>) -> Self {
        Self { time: S::zero(), depth: S::zero(), velocity: problem.impact_speed }
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

/// What happened at a place. The order of the variants is the order of events at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EventKind {
    /// End of stage `.0` (index from 0) that is not the crater's.
    StageEnd(usize),
    /// Depth k d reached, touching included.
    CraterEnd,
    /// Exit depth reached, touching included.
    Exit,
    /// Velocity zero.
    Rest,
}

impl EventKind {
    /// The event at the end of stage `index` of `problem`.
    pub fn boundary<S: Scalar>(problem: &Problem<S>, index: usize) -> Self {
        if fault!("crater-end-unnamed", problem.crater == Some(index), false) {
            Self::CraterEnd
        } else {
            Self::StageEnd(index)
        }
    }

    /// Name in the contract: `crater-end`, `stage-end`, `exit`, `rest`.
    pub fn name(self) -> &'static str {
        match self {
            Self::StageEnd(_) => "stage-end",
            Self::CraterEnd => "crater-end",
            Self::Exit => "exit",
            Self::Rest => "rest",
        }
    }
}

/// An event and the state in which it happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<S = f64> {
    /// What happened.
    pub kind: EventKind,
    /// When, where and how fast.
    pub state: State<S>,
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// Rest at x <= k d.
    StoppedInCrater,
    /// Rest beyond k d, before the exit depth.
    StoppedInTunnel,
    /// Rest in a target of stages or layers, before the exit depth.
    Stopped,
    /// The exit depth was reached, with or without velocity left.
    Perforated,
    /// The exit margin lies inside its error bar: this method cannot tell.
    Undecided,
}

impl Outcome {
    /// Name in the contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::StoppedInCrater => "stopped-in-crater",
            Self::StoppedInTunnel => "stopped-in-tunnel",
            Self::Stopped => "stopped",
            Self::Perforated => "perforated",
            Self::Undecided => "undecided",
        }
    }

    /// Whether the projectile came to rest inside the target.
    pub fn is_stop(self) -> bool {
        matches!(self, Self::StoppedInCrater | Self::StoppedInTunnel | Self::Stopped)
    }

    /// Whether two outcomes are the same fact: stops are, in whatever stage, when one lies within round-off of k d.
    pub fn agrees_with(self, other: Self) -> bool {
        self == other || (self.is_stop() && other.is_stop())
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_and_outcomes_are_shown_by_their_numbers_with_units_and_their_names() {
        let state = State { time: 0.5, depth: 0.25, velocity: 100.0 };
        assert_eq!(state.to_string(), "t = 0.5 s, x = 0.25 m, V = 100 m/s");
        assert_eq!(Outcome::StoppedInCrater.to_string(), "stopped-in-crater");
    }
}
