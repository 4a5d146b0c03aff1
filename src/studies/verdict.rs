//! What can a measurement come to?

use serde::Serialize;

/// What a claim, a fit or a table can come to. The order of the variants is the order of severity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, strum::IntoStaticStr)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Verdict {
    /// Within its limit; as expected where something was expected.
    Passed,
    /// Does not apply; does not count.
    Skipped,
    /// Cannot be decided: noise, round-off floor, inside an error bound.
    Undecided,
    /// Beyond its limit, not a number, or not as expected.
    #[default]
    Failed,
}

impl Verdict {
    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// `measured` against `limit`. What is not a number fails: it never passes.
    pub fn of(measured: f64, limit: f64) -> Self {
        if measured <= limit { Self::Passed } else { Self::Failed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_never_passes() {
        assert_eq!(Verdict::of(f64::NAN, 1.0), Verdict::Failed);
        assert_eq!(Verdict::of(f64::INFINITY, 1.0), Verdict::Failed);
        assert_eq!(Verdict::of(1.0, f64::NAN), Verdict::Failed);
        assert_eq!(Verdict::of(1.0, 1.0), Verdict::Passed);
    }
}
