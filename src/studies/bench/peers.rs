//! Error and cost of other programs, through the peer protocol.
//!
//! A peer times itself (`wall_ns`, and `wall_ns_quartiles` where it gives the spread): reading, writing and whatever it
//! prepares for a question do not count, so that a compiled integrator is timed compiled. The first question of each
//! kind asks for one flight and warms it; the second asks for as many as are timed, and is left out where one is enough.

use super::timing::{Effort, Timing};
use super::work_precision::{Case, Judgement, Known, Run, Setting, Tally, until_too_long};
use crate::exchange::peers::{BundledPeer, NO_LAWS, Peer, PeerAnswer, PeerFailure, PeerRequest};

/// Tolerances that peers are asked for, by their digits.
const DIGITS: std::ops::RangeInclusive<i32> = 2..=13;

/// Time that the repeats of one question may take (ns).
const TOGETHER_NS: f64 = 1e9;

/// A peer whose pass over the scenes took longer than this is not asked at finer tolerances (s).
const PASS_S: f64 = 20.0;

/// Flights of one question at most.
const REPEATS_MAX: u32 = 10_000;

/// Flights of one scene where a case has many.
const REPEATS_OF_MANY: u32 = 3;

/// Where a case has many scenes, a flight that takes longer is timed once (ns): what a first one costs more is little
/// beside it, and the mean is over the scenes.
const LONG_NS: f64 = 1e5;

/// The peers that ship, with the options that put each at its best: name, program, options.
pub const BUNDLED: [(&str, BundledPeer, &str); 6] = [
    ("heyoka", BundledPeer::Heyoka, ""),
    ("heyoka, 8 lanes", BundledPeer::Heyoka, "--lanes 8"),
    ("scipy RK45", BundledPeer::Scipy, ""),
    ("scipy DOP853", BundledPeer::Scipy, "--method DOP853"),
    ("sundae Adams", BundledPeer::SundaeAdams, ""),
    ("sundae BDF", BundledPeer::SundaeBdf, ""),
];

/// Whether `peer` tells its time. Nobody knows of one that gives no answer: each of its runs will say why.
pub fn is_timed(case: &Case, peer: &mut Peer) -> bool {
    let first = case.problems.first().map(|known| PeerRequest::from_problem(&known.problem, 1e-6));
    first.and_then(|request| peer.ask(&request).ok()).is_none_or(|answer| answer.wall_ns.is_some())
}

/// Every tolerance of `peer`, called `name`, on `case`. What goes wrong is a run that failed.
pub fn runs(case: &Case, name: &str, peer: &mut Peer, effort: Effort) -> Vec<Run> {
    let settings = DIGITS.map(|digits| Setting::Tolerance(10f64.powi(-digits))).collect();
    until_too_long(case, name, settings, PASS_S, |setting, tally| run(case, peer, setting, effort, tally))
}

fn run(case: &Case, peer: &mut Peer, setting: Setting, effort: Effort, mut tally: Tally) -> Run {
    let Setting::Tolerance(rtol) = setting else { return tally.not_run("a peer is asked for a tolerance") };
    if case.problems.iter().any(|known| !known.problem.laws.is_empty()) {
        return tally.not_run(NO_LAWS);
    }
    let mut timings = Vec::new();
    for known in &case.problems {
        let request = PeerRequest::from_problem(&known.problem, rtol);
        match ask(peer, &request, case.problems.len() > 1, effort) {
            Ok((answer, timing)) => {
                tally.add(judge(known, &answer), answer.force_evaluations);
                timings.extend(timing);
            }
            Err(failure) => tally.add(Judgement::Failed(failure.to_string()), None),
        }
    }
    tally.finish(mean(&timings))
}

/// The answer, and the time of one flight if the peer measures it.
fn ask(
    peer: &mut Peer,
    request: &PeerRequest,
    of_many: bool,
    effort: Effort,
) -> Result<(PeerAnswer, Option<Timing>), PeerFailure> {
    let first = peer.ask(request)?;
    let Some(first_ns) = first.wall_ns else { return Ok((first, None)) };
    if of_many && first_ns > LONG_NS {
        let timing = Timing::of(vec![first_ns]);
        return Ok((first, timing));
    }
    let fitting = (TOGETHER_NS / first_ns.max(1.0)) as u32;
    let wanted = if of_many { REPEATS_OF_MANY } else { (effort.samples as u32).saturating_mul(100) };
    // Two at least: the first flight of a question is not warm.
    let repeats = wanted.min(fitting).clamp(2, REPEATS_MAX);
    let answer = peer.ask(&PeerRequest { repeats, ..request.clone() })?;
    let timing = answer.wall_ns.map(|median_ns| {
        let [low_ns, high_ns] = answer.wall_ns_quartiles.unwrap_or([median_ns; 2]);
        Timing { median_ns, low_ns, high_ns, samples: repeats as usize }
    });
    Ok((answer, timing))
}

/// The mean over scenes; `None` without a time.
fn mean(timings: &[Timing]) -> Option<Timing> {
    let samples = timings.iter().map(|t| t.samples).min()?;
    let sum = |of: fn(&Timing) -> f64| timings.iter().map(of).sum::<f64>();
    let together =
        Timing { median_ns: sum(|t| t.median_ns), low_ns: sum(|t| t.low_ns), high_ns: sum(|t| t.high_ns), samples };
    Some(together.over(timings.len()))
}

fn judge(known: &Known, answer: &PeerAnswer) -> Judgement {
    // Events are not compulsory: what is not listed is not judged, but the end always is.
    known.judge(&answer.flight(&known.problem), !answer.events.is_empty())
}
