//! How the verdicts of claims add up.

use schemars::JsonSchema;
use serde::Serialize;

use super::claim::Judged;
pub use crate::studies::Verdict;

/// How many claims came to what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Counts {
    /// Within their limits.
    pub passed: usize,
    /// Beyond them.
    pub failed: usize,
    /// Not decidable.
    pub undecided: usize,
    /// Not applicable.
    pub skipped: usize,
}

impl Counts {
    /// Counts the verdicts.
    pub fn of(verdicts: impl IntoIterator<Item = Verdict>) -> Self {
        let mut counts = Self::default();
        for verdict in verdicts {
            match verdict {
                Verdict::Passed => counts.passed += 1,
                Verdict::Failed => counts.failed += 1,
                Verdict::Undecided => counts.undecided += 1,
                Verdict::Skipped => counts.skipped += 1,
            }
        }
        counts
    }

    /// Counts the verdicts of judged claims.
    pub fn of_claims<'a>(judged: impl IntoIterator<Item = &'a Judged>) -> Self {
        Self::of(judged.into_iter().map(|judged| judged.verdict))
    }

    /// Verdicts and their numbers, the gravest first.
    pub fn each(&self) -> [(Verdict, usize); 4] {
        [
            (Verdict::Failed, self.failed),
            (Verdict::Undecided, self.undecided),
            (Verdict::Passed, self.passed),
            (Verdict::Skipped, self.skipped),
        ]
    }

    /// The verdict of a group of claims: skipped if all of them were, else [`Counts::verdict`].
    pub fn of_group(&self) -> Verdict {
        if self.skipped > 0 && self.skipped == self.each().iter().map(|(_, number)| number).sum::<usize>() {
            Verdict::Skipped
        } else {
            self.verdict()
        }
    }

    /// The verdict of the whole: failed if a claim failed, else undecided if one is, else passed.
    ///
    /// A suite in which nothing was decided has shown nothing and is undecided.
    pub fn verdict(&self) -> Verdict {
        if self.failed > 0 {
            Verdict::Failed
        } else if self.undecided > 0 || self.passed == 0 {
            Verdict::Undecided
        } else {
            Verdict::Passed
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_suite_has_shown_nothing() {
        assert_eq!(Counts::of([]).verdict(), Verdict::Undecided);
        assert_eq!(Counts::of([Verdict::Skipped]).verdict(), Verdict::Undecided);
        assert_eq!(Counts::of([Verdict::Passed, Verdict::Skipped]).verdict(), Verdict::Passed);
        assert_eq!(Counts::of([Verdict::Passed, Verdict::Undecided]).verdict(), Verdict::Undecided);
        assert_eq!(Counts::of([Verdict::Undecided, Verdict::Failed]).verdict(), Verdict::Failed);
    }
}
