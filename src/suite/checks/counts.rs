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
    /// What every claim measures beside what it measured when a person last looked (`verification/measured.toml`, seed 1): claims
    /// that measure another number, or on fewer cases. A check that sees less than it did passes everywhere else.
    Remeasured {
        /// Factor within which two numbers above round-off are the same.
        #[serde(deserialize_with = "crate::suite::checks::positive")]
        within: f64,
        /// The same of round-off, which another processor or library of mathematics has otherwise.
        #[serde(deserialize_with = "crate::suite::checks::positive")]
        rounding_within: f64,
    } in Judge, "differences", by remeasured, compares nothing;
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
    holds!(!families.is_empty(), "there is no family to count");
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

/// What was measured by the id of the claim: the number, and on how many cases.
const MEASURED: &str = include_str!("../../../verification/measured.toml");

/// The seed of those measurements.
const SEED: u64 = 1;

fn remeasured(check: &Remeasured, subject: &Subject<'_>) -> Found {
    let judged = subject.context.judged.ok_or_else(|| NotMeasured::skip("a part of the suite was run"))?;
    applies!(subject.context.seed == SEED, "measurements are recorded for the seed {SEED}");
    let recorded: BTreeMap<String, (f64, usize)> = toml::from_str(MEASURED)?;
    let of = |judged: &Judged| recorded.get(&judged.claim.id).copied();
    let known: Vec<_> =
        judged.iter().filter(|judged| !judged.lacks).filter_map(|judged| Some((judged, of(judged)?))).collect();
    let different: Vec<_> = known
        .iter()
        .filter(|(judged, (was, cases))| {
            let is_same = judged.measured.is_some_and(|is| check.is_same(judged.claim.unit, *was, is));
            !is_same || judged.cases * 10 < cases * 9
        })
        .map(|(judged, (was, cases))| {
            let Judged { claim, measured, cases: now, .. } = judged;
            let measured = measured.map_or_else(|| "nothing".to_owned(), |measured| format!("{measured:e}"));
            format!("{}: {measured} on {now} cases, and {was:e} on {cases} before", claim.id)
        })
        .collect();
    let remark = if different.is_empty() { format!("{} claims", known.len()) } else { different.join("; ") };
    Ok(Measurement::count(different.len()).remark(remark).cases(known.len()))
}

impl Remeasured {
    /// What is smaller is round-off where it is relative; in units of it, all is.
    const ROUNDING: f64 = 2e-12;
    const UNITS_OF_ROUNDING: [&str; 5] =
        ["ulp", "ulp x condition", "promises x condition", "error bars", "compensated/plain"];
    /// What is smaller is nothing.
    const NOTHING: f64 = 1e-15;

    fn is_same(&self, unit: &str, was: f64, is: f64) -> bool {
        let is_rounding = was.max(is) < Self::ROUNDING || Self::UNITS_OF_ROUNDING.contains(&unit);
        let within = if is_rounding { self.rounding_within } else { self.within };
        let [was, is] = [was, is].map(|size| size.max(Self::NOTHING));
        was <= within * is && is <= within * was
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
