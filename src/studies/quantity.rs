//! The quantities whose error is studied, under their names in the contract.

/// A number that a flight, or a search over flights, gives.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
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
    /// Least impact velocity that perforates [m/s].
    CriticalVelocity,
}

impl Quantity {
    /// Every quantity, in the order of reports.
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

    /// The quantity called `name` in the contract.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.name() == name)
    }
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_reads_back() {
        for quantity in Quantity::ALL {
            assert_eq!(Quantity::from_name(quantity.name()), Some(quantity));
        }
        assert_eq!(Quantity::from_name("Depth"), None);
    }
}
