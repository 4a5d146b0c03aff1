//! The quantities whose convergence is studied, under their names in the contract.

/// A number that a flight, or a search over flights, delivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Depth at the end of the flight [m].
    Depth,
    /// Time of the end of the flight [s].
    Time,
    /// Velocity at the end of the flight [m/s].
    Velocity,
    /// Time at x = k d [s].
    CraterEndTime,
    /// Velocity at x = k d [m/s].
    CraterEndVelocity,
    /// Critical velocity `V_c` [m/s].
    CriticalVelocity,
}

impl Quantity {
    /// Every quantity, in the order of the contract.
    pub const ALL: [Self; 6] =
        [Self::Depth, Self::Time, Self::Velocity, Self::CraterEndTime, Self::CraterEndVelocity, Self::CriticalVelocity];

    /// Name in the contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Time => "time",
            Self::Velocity => "velocity",
            Self::CraterEndTime => "crater_end_time",
            Self::CraterEndVelocity => "crater_end_velocity",
            Self::CriticalVelocity => "critical_velocity",
        }
    }
}
