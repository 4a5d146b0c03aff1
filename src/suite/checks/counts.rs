//! Is every claim still there, and was it measured?

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Subject;
use crate::suite::claim::{Found, Judged, Measurement, NotMeasured};
use crate::suite::roads::{roads, shared};
use crate::suite::verdict::Verdict;

check! {
    /// The claims of each family (the first part of the id) against the numbers written in the suite: families that
    /// differ. A family with fewer cases, or with more skipped claims than this build and run explain, differs.
    Counted {
        /// What each family must have.
        families: BTreeMap<String, Family>,
    } in Judge, "families", by counted, compares nothing;
    /// Claims whose two computations share more than the scene ([`crate::suite::roads`]).
    Independent {} in Judge, "claims", by independent, compares nothing;
}

/// What a family of claims must have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Family {
    /// Claims.
    pub claims: usize,
    /// Those of them that are skipped, at most.
    pub skipped: usize,
    /// Cases that they are measured on, at least; left out where this run lacks something.
    pub cases: usize,
}

fn counted(Counted { families }: &Counted, subject: &Subject<'_>) -> Found {
    let judged = subject.context.judged.ok_or_else(|| NotMeasured::skip("a part of the suite was run"))?;
    let mut found: BTreeMap<&str, Vec<&Judged>> = families.keys().map(|name| (name.as_str(), Vec::new())).collect();
    for claim in judged {
        found.entry(claim.claim.group()).or_default().push(claim);
    }
    let different: Vec<_> = found
        .iter()
        .filter_map(|(name, claims)| {
            let difference = difference(families.get(*name).copied().unwrap_or_default(), claims)?;
            Some(format!("{name}: {difference}"))
        })
        .collect();
    let remark = if different.is_empty() { format!("{} claims", judged.len()) } else { different.join("; ") };
    Ok(Measurement::count(different.len()).remark(remark).cases(judged.len()))
}

/// How `claims` differ from what their family must have.
fn difference(family: Family, claims: &[&Judged]) -> Option<String> {
    let lacking = claims.iter().filter(|claim| claim.lacks).count();
    let skipped = claims.iter().filter(|claim| claim.verdict == Verdict::Skipped && !claim.lacks).count();
    let cases: usize = claims.iter().map(|claim| claim.cases).sum();
    let number = claims.len();
    if number != family.claims {
        Some(format!("{number} claims, and the suite counts {}", family.claims))
    } else if skipped > family.skipped {
        Some(format!("{skipped} claims are skipped, and the suite counts {}", family.skipped))
    } else if lacking == 0 && cases < family.cases {
        Some(format!("{cases} cases, and the suite counts {}", family.cases))
    } else {
        None
    }
}

fn independent(subject: &Subject<'_>) -> Found {
    let judged = subject.context.judged.ok_or_else(|| NotMeasured::skip("a part of the suite was run"))?;
    let compared: Vec<_> = judged.iter().filter_map(|judged| Some((&judged.claim, roads(&judged.claim)?))).collect();
    let shared: Vec<_> = compared.iter().filter_map(|(claim, roads)| Some((*claim, shared(roads)?))).collect();
    let remark = match shared.first() {
        Some((claim, source)) => format!("both computations of {} come from: {source}", claim.id),
        None => format!("{} claims compare two computations that share nothing but the scene", compared.len()),
    };
    Ok(Measurement::count(shared.len()).remark(remark).cases(compared.len()))
}
