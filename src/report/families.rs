//! Claims that were one table of the suite, together again.

use crate::suite::{Counts, Judged, Verdict};

/// Claims of one statement, limit and reason, one after the other in the suite.
#[derive(Clone, Debug)]
pub struct Family<'a> {
    /// Common beginning of their ids.
    pub id: &'a str,
    /// The claims, at least one.
    pub members: &'a [Judged],
}

impl<'a> Family<'a> {
    /// The families of a judged suite, in its order.
    pub fn all(judged: &'a [Judged]) -> Vec<Self> {
        judged
            .chunk_by(|a, b| {
                let (a, b) = (&a.claim, &b.claim);
                a.statement == b.statement && a.limit == b.limit && a.reason == b.reason && a.check == b.check
            })
            .map(|members| Self { id: common_id(members), members })
            .collect()
    }

    /// The first of them, which says what all claim.
    pub fn first(&self) -> &'a Judged {
        &self.members[0]
    }

    /// What became of them.
    pub fn counts(&self) -> Counts {
        Counts::of(self.members.iter().map(|j| j.verdict))
    }

    /// The gravest of what became of them; skipped only where all were.
    pub fn verdict(&self) -> Verdict {
        let counts = self.counts();
        if counts.skipped == self.members.len() { Verdict::Skipped } else { counts.verdict() }
    }

    /// The largest measured value.
    pub fn worst(&self) -> Option<f64> {
        self.members.iter().filter_map(|j| j.measured).max_by(f64::total_cmp)
    }
}

/// First part of an id, by which claims are grouped.
pub fn group_of(id: &str) -> &str {
    id.split('/').next().unwrap_or(id)
}

fn common_id(members: &[Judged]) -> &str {
    let first = members[0].claim.id.as_str();
    let shared = members[1..].iter().fold(first.len(), |shared, judged| {
        let same = first.bytes().zip(judged.claim.id.bytes()).take_while(|(a, b)| a == b).count();
        // A member may be the beginning of another: `order/critical-velocity` is whole there.
        let whole = same == first.len() || first.as_bytes()[same] == b'/';
        let whole = whole && (same == judged.claim.id.len() || judged.claim.id.as_bytes()[same] == b'/');
        let end = if whole { same } else { first[..same].rfind('/').unwrap_or(0) };
        shared.min(end)
    });
    if shared == 0 { first } else { &first[..shared] }
}
