//! The quantities whose error is studied, and their names (`docs/reference.md`, "Words").

use serde::{Deserialize, Serialize};
use strum::{Display, IntoStaticStr};

/// A number that a flight, or a search over flights, gives.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, Display, IntoStaticStr,
)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Quantity {
    /// Depth at the end of the flight (m).
    #[default]
    Depth,
    /// Time of the end of the flight (s).
    Time,
    /// Velocity at the end of the flight (m/s).
    Velocity,
    /// Time at x = k d (s).
    CraterEndTime,
    /// Velocity at x = k d (m/s).
    CraterEndVelocity,
    /// Least impact velocity that perforates (m/s).
    CriticalVelocity,
}

impl Quantity {
    /// Every quantity, in the order of reports.
    pub const ALL: [Self; 6] =
        [Self::Depth, Self::Time, Self::Velocity, Self::CraterEndTime, Self::CraterEndVelocity, Self::CriticalVelocity];

    /// The quantities of one flight, in the order of reports.
    pub const OF_A_FLIGHT: [Self; 5] =
        [Self::Depth, Self::Time, Self::Velocity, Self::CraterEndTime, Self::CraterEndVelocity];

    /// Whether it belongs to the state at x = k d.
    pub fn is_at_crater_end(self) -> bool {
        matches!(self, Self::CraterEndTime | Self::CraterEndVelocity)
    }

    /// Whether its error is relative to V0, and not to its own value.
    pub fn is_over_impact_speed(self) -> bool {
        matches!(self, Self::Velocity | Self::CraterEndVelocity)
    }

    /// Unit of its value.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Depth => "m",
            Self::Time | Self::CraterEndTime => "s",
            Self::Velocity | Self::CraterEndVelocity | Self::CriticalVelocity => "m/s",
        }
    }

    /// Name in JSON and in suites.
    pub fn name(self) -> &'static str {
        self.into()
    }
}
