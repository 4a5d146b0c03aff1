//! Does the shipped suite notice when the program is wrong? Each seeded fault must turn a claim red, by name.
//!
//! The faults are compiled in behind the feature `faults` (`src/fault.rs`); without it there is nothing to test and
//! the test says how to run it. One fault after the other, since a fault is active in the whole process.

use libtest_mimic::{Arguments, Trial};

fn main() {
    let arguments = Arguments { test_threads: Some(1), ..Arguments::from_args() };
    let conclusion = libtest_mimic::run(&arguments, faults::trials());
    faults::print_table();
    conclusion.exit();
}

#[cfg(not(feature = "faults"))]
mod faults {
    use super::Trial;

    const HOW: &str = "run `cargo test --release --features faults --test seeded_faults`";

    pub(super) fn trials() -> Vec<Trial> {
        eprintln!("seeded faults ignored: they are not in this build; {HOW}");
        vec![Trial::test("every_seeded_fault_turns_a_claim_red", || Err(HOW.into())).with_ignored_flag(true)]
    }

    pub(super) fn print_table() {}
}

#[cfg(feature = "faults")]
mod faults {
    use std::collections::BTreeSet;
    use std::sync::{Mutex, OnceLock, PoisonError};

    use libtest_mimic::Failed;
    use penetrode::suite::checks::PeerAnswers;
    use penetrode::suite::{Judged, Suite, Verdict};
    use penetrode::{FAULTS, Fault, Seeded};

    use super::Trial;

    const SEED: u64 = 1;

    /// Fault, claim that failed, and what it measured.
    static CAUGHT: Mutex<Vec<(&Fault, String, String)>> = Mutex::new(Vec::new());

    pub(super) fn trials() -> Vec<Trial> {
        let mut trials = vec![Trial::test("without_a_fault_no_claim_fails", || match healthy() {
            failed if failed.is_empty() => Ok(()),
            failed => Err(format!("{failed:?}").into()),
        })];
        // A fault of a file that this build leaves out cannot show.
        let built = FAULTS.iter().filter(|fault| cfg!(feature = "diffsol") || !fault.file.ends_with("diffsol.rs"));
        trials.extend(built.map(|fault| Trial::test(fault.id, || turns_a_claim_red(fault))));
        trials
    }

    /// Claims that fail without any fault: none of them may count as noticing one.
    fn healthy() -> &'static BTreeSet<String> {
        static HEALTHY: OnceLock<BTreeSet<String>> = OnceLock::new();
        HEALTHY.get_or_init(|| failures("").into_iter().map(|judged| judged.claim.id).collect())
    }

    /// The claims that fail among those whose id contains one of `patterns`, separated by `|`.
    fn failures(patterns: &str) -> Vec<Judged> {
        // Read anew each time: the scenes of a suite hold what formulas made of their files.
        let mut suite = match Suite::embedded() {
            Ok(suite) => suite,
            Err(error) => panic!("the suite is refused: {error}"),
        };
        suite.claims.retain(|claim| patterns.split('|').any(|part| claim.id.contains(part)));
        let mut judged = suite.run(SEED, &PeerAnswers::default(), &|_| ());
        judged.retain(|judged| judged.verdict == Verdict::Failed);
        judged
    }

    fn turns_a_claim_red(fault: &'static Fault) -> Result<(), Failed> {
        let healthy = healthy();
        let _seeded = Seeded::activate(fault);
        for patterns in [fault.claims, ""] {
            if let Some(judged) = failures(patterns).into_iter().find(|judged| !healthy.contains(&judged.claim.id)) {
                let seen =
                    judged.measured.map_or(judged.remark.clone(), |m| format!("{m:.2e} > {:.0e}", judged.claim.limit));
                let mut caught = CAUGHT.lock().unwrap_or_else(PoisonError::into_inner);
                caught.push((fault, judged.claim.id, seen));
                return Ok(());
            }
        }
        Err(format!("no claim notices: {} (src/{})", fault.what, fault.file).into())
    }

    pub(super) fn print_table() {
        let caught = CAUGHT.lock().unwrap_or_else(PoisonError::into_inner);
        for (fault, claim, seen) in caught.iter() {
            println!("{:26} {:34} {:62} {claim}: {seen}", fault.id, fault.file, fault.what);
        }
    }
}
