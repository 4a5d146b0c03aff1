//! Is a solver of fixed steps right, in which order do its answers converge, and what is wrong with it?
//!
//! A question is a problem with its ladder of steps, and its limit is judged (`ladder`). A consistent scheme is sound whatever its
//! order; what lowers the order is named.

use std::collections::BTreeMap;

use super::causes::{Cause, Certainty, Effort, Seen, causes};
use super::crowded::crowded;
use super::hypotheses::How;
use super::ladder::{FINER, LADDER, Limit, REPRODUCED, Rung, coarsest_step, order, pooled, rung_errors, schemes};
use super::numbers::few_digits;
use super::questions::{Content, Question};
use super::tolerances::wrong_list;
use super::{
    Asked, Asking, Diagnosis, Each, End, QUANTITIES, QuantityOrder, Reproduced, Subject, TOLERANCES, count, end_of,
    expected, finish, request,
};
use crate::exchange::peers::process::ORDER_OF_ALL;
use crate::exchange::peers::wire::errors;
use crate::exchange::peers::{Difference, PeerIdentity, PeerRequest};
use crate::integrators::{Boundaries, VelocityAt};
use crate::physics::{Event, Outcome, State};
use crate::studies::order::{Class, OrderFit, StepError, fit};
use crate::studies::scheme_of_table::Scheme;
use crate::studies::verdict::Verdict;

/// Questions of fixed steps.
const FIXED_QUESTIONS: usize = 120;
/// Steps of all questions of fixed steps at most.
const STEPS_TOTAL: f64 = 1e6;
/// Questions that are asked at a far smaller step, and that step over the coarsest.
const FLOOR_QUESTIONS: usize = 8;
const FLOOR_STEP: f64 = 0.002;
/// Error over the condition above which one that does not fall is no round-off of 64-bit numbers, and how far above what
/// its order promises.
const FLOOR_MAX: f64 = 1e-8;
const FLOOR_EXCESS: f64 = 10.0;
/// Answers that must end after one number of steps, and the error at a far smaller step from which a flight may be cut short.
const LEAST_CUTS: usize = 3;
/// The order that a scheme has at least where nothing lowers it to one, and how far below and beside an order is lost and kept.
const SECOND: f64 = 2.0;
const LOST: f64 = 0.5;
const KEPT: f64 = 0.4;
const CUT: f64 = 1e-2;
/// One question of so many may fail where an order does.
pub(super) const FEW: usize = 20;
/// Least order with which errors of a sound scheme fall.
const FLOOR_ORDER: f64 = 0.8;
/// Part of V0 below which an end of a stage may be missed: rest is near.
const OPEN_SPEED: f64 = 0.1;
/// An order claimed may exceed the one found by this part of it: the steps are not small for every question.
const ORDER_MARGIN: f64 = 0.15;

/// Diagnosis of a solver that takes a fixed step.
pub(super) fn in_fixed_steps(
    asking: &mut Asking<'_>,
    peer: Subject,
    identity: &PeerIdentity,
    all: &[Question],
    progress: &dyn Fn(usize, usize),
) -> Diagnosis {
    let usable: Vec<(&Question, f64)> =
        all.iter().filter_map(|question| Some((question, coarsest_step(question)?))).take(FIXED_QUESTIONS).collect();
    let mut steps = 0.0;
    let mut laddered: Vec<Laddered<'_>> = Vec::new();
    for (index, (question, coarsest)) in usable.iter().enumerate() {
        let mut next = Laddered {
            question,
            coarsest: *coarsest,
            rungs: Vec::new(),
            listed: Vec::new(),
            list: None,
            failure: None,
        };
        steps += next.climb(asking, &LADDER);
        // A limit that seems wrong is looked at again.
        if next.failure.is_none() && (next.is(Limit::is_suspect) || next.wrong_event().is_some()) {
            steps += next.climb(asking, &FINER);
        }
        laddered.push(next);
        progress(index + 1, usable.len());
        if asking.is_gone || steps > STEPS_TOTAL {
            break;
        }
    }
    let mut rows: Vec<Asked> = laddered.iter().map(Laddered::row).collect();
    let lists = if asking.is_gone { Vec::new() } else { crowded(asking, all) };
    rows.extend(lists);
    let counts = count(&rows, usable.len() + rows.len() - laddered.len());
    let right: Vec<(&Question, &[Rung])> = laddered
        .iter()
        .zip(&rows)
        .filter(|(_, row)| row.verdict == Verdict::Passed)
        .map(|(laddered, _)| (laddered.question, &laddered.rungs[..]))
        .collect();
    let reproducing = schemes(&right);
    let orders = orders(&right, identity);
    let fails_an_order = orders.iter().any(|order| order.verdict == Verdict::Failed);
    let floor = floor(asking, &right).or_else(|| few_digits(laddered.iter().flat_map(Laddered::ends), counts.failed));
    let verdict = match () {
        () if counts.failed > 0 || fails_an_order || floor.is_some() => Verdict::Failed,
        () if counts.passed == 0 || counts.undecided > counts.passed => Verdict::Undecided,
        () => Verdict::Passed,
    };
    let mut causes: Vec<Cause> = floor.into_iter().collect();
    let is_same = |one: &&Laddered<'_>| one.rungs.windows(2).all(|pair| pair[0].answer == pair[1].answer);
    if counts.failed > 0 && laddered.iter().filter(is_same).count() * 10 >= laddered.len() * 9 {
        let statement = "answers are the same whatever the step: dt_s is ignored".to_owned();
        causes.push(Cause::plain("step-ignored", statement, Certainty::Certain, counts.failed, counts.failed));
    } else if counts.failed > 0
        && let Some(cause) = of_events(&laddered, &rows, counts.failed)
    {
        causes.push(cause);
    } else if counts.failed > 0
        && let Some(cause) = budget(&cut_short(&laddered)).or_else(|| least_step(&laddered, &rows))
    {
        causes.push(cause);
    } else if counts.failed > 0 {
        causes.extend(fixed_causes(&laddered, &rows, &reproducing, identity, all));
    }
    // A limit or two may seem wrong where an order is lower than claimed.
    let is_open = causes.iter().all(|cause| cause.certainty == Certainty::Possible);
    let is_of_order = is_open && fails_an_order && FEW * counts.failed <= counts.asked;
    let scheme = reproducing.first();
    // What has no order is lowered by nothing else.
    if counts.failed == 0 && causes.is_empty() || is_of_order {
        causes.splice(0..0, what_lowers(scheme.map(|(scheme, _)| *scheme), &right, &orders));
    }
    let scheme = scheme.map(|(scheme, largest)| Reproduced {
        name: scheme.name(),
        velocity: scheme.velocity().map(VelocityAt::name),
        events: Some(scheme.events().name()),
        largest_difference: *largest,
    });
    let scheme = scheme.filter(|_| counts.failed == 0);
    let diagnosis = Diagnosis { verdict, peer, counts, causes, scheme, orders, separation: None, questions: rows };
    if counts.failed > 0 { finish(diagnosis) } else { diagnosis }
}

/// A question of fixed steps and its answers.
struct Laddered<'a> {
    question: &'a Question,
    coarsest: f64,
    rungs: Vec<Rung>,
    /// How far the events listed differ from the right ones, rung by rung.
    listed: Vec<Vec<Difference>>,
    /// What is wrong with the list of the smallest step, whatever its numbers.
    list: Option<String>,
    failure: Option<String>,
}

impl Laddered<'_> {
    /// Asks on `parts` of the coarsest step; the number of steps that took.
    fn climb(&mut self, asking: &mut Asking<'_>, parts: &[f64]) -> f64 {
        let mut steps = 0.0;
        for part in parts {
            let step = part * self.coarsest;
            steps += self.question.exact.end.time / step;
            let asked = PeerRequest { dt_s: Some(step), ..request(self.question, TOLERANCES[0]) };
            match asking.ask(&asked) {
                Ok(answer) => {
                    self.rungs.push(Rung {
                        step,
                        answer: end_of(&answer).state,
                        is_outcome_right: answer.outcome.agrees_with(self.question.exact.outcome),
                    });
                    // What is left with little speed is near its rest, and reached or not.
                    let is_open =
                        |event: &Event| event.state.velocity < OPEN_SPEED * self.question.problem.impact_speed;
                    self.list = wrong_list(self.question, &asked, &answer, is_open);
                    let of_end = |difference: &Difference| !QUANTITIES.contains(&difference.quantity.as_str());
                    let all = answer.differences_from(&self.question.exact, &self.question.problem);
                    self.listed.push(all.unwrap_or_default().into_iter().filter(of_end).collect());
                }
                Err(why) => {
                    self.failure = (!asking.may_decline(self.question)).then_some(why);
                    break;
                }
            }
        }
        steps
    }

    fn ends(&self) -> impl Iterator<Item = State> {
        self.rungs.iter().map(|rung| rung.answer)
    }

    fn limits(&self) -> [Option<Limit>; 3] {
        let errors = rung_errors(self.question, &self.rungs);
        [0, 1, 2].map(|which| {
            let points: Vec<_> = self.rungs.iter().zip(&errors).map(|(rung, all)| (rung.step, all[which])).collect();
            Limit::of(&points)
        })
    }

    fn is(&self, of: impl Fn(&Limit, f64) -> bool) -> bool {
        let wrong_outcome = self.rungs.last().is_some_and(|rung| !rung.is_outcome_right);
        wrong_outcome || self.any_limit(of)
    }

    /// Whether its numbers go to the right limits, and its outcome is another at the finest step.
    fn is_misnamed(&self) -> bool {
        let finest = self.rungs.iter().min_by(|a, b| a.step.total_cmp(&b.step));
        finest.is_some_and(|rung| !rung.is_outcome_right) && !self.any_limit(Limit::is_wrong)
    }

    /// Whether the limit of a quantity is as `of` says.
    fn any_limit(&self, of: impl Fn(&Limit, f64) -> bool) -> bool {
        (0..3).any(|i| self.limits()[i].is_some_and(|limit| of(&limit, self.question.conditions[i])))
    }

    /// What is wrong with the events listed: their list, or the limit of a number.
    fn wrong_event(&self) -> Option<String> {
        let limit = || {
            self.listed.first()?.iter().find_map(|Difference { quantity, conditioning, .. }| {
                let of_rung = |(rung, all): (&Rung, &Vec<Difference>)| {
                    Some((rung.step, all.iter().find(|other| other.quantity == *quantity)?.signed))
                };
                let points: Vec<_> = self.rungs.iter().zip(&self.listed).filter_map(of_rung).collect();
                let limit = Limit::of(&points).filter(|_| points.len() == self.rungs.len())?;
                let said = || {
                    format!("the event listed is off: {quantity} goes to a limit that is off by {:+.2e}", limit.error)
                };
                limit.is_wrong(*conditioning).then(said)
            })
        };
        self.list.clone().or_else(limit)
    }

    /// The same where the end is right.
    fn wrong_in_events(&self) -> Option<String> {
        let is_right = self.failure.is_none() && !self.is(Limit::is_suspect);
        is_right.then(|| self.wrong_event()).flatten()
    }

    fn row(&self) -> Asked {
        let question = self.question;
        let last = self.rungs.iter().min_by(|a, b| a.step.total_cmp(&b.step));
        let limits = self.limits();
        let is_wrong = |i: usize| limits[i].is_some_and(|limit| limit.is_wrong(question.conditions[i]));
        let wrong = (0..3).find(|i| is_wrong(*i));
        let suspect = (0..3).find(|i| limits[*i].is_some_and(|limit| limit.is_suspect(question.conditions[*i])));
        let finest: Vec<&Rung> = self.rungs.iter().rev().take(2).collect();
        let (verdict, reason) = if let Some(why) = &self.failure {
            (Verdict::Failed, why.clone())
        } else if finest.is_empty() {
            (Verdict::Skipped, String::new())
        } else if finest.iter().all(|rung| !rung.is_outcome_right) {
            (Verdict::Failed, format!("the outcome at small steps is not {}", question.exact.outcome))
        } else if let Some(i) = wrong {
            let error = limits[i].map_or(f64::NAN, |limit| limit.error);
            (Verdict::Failed, format!("{} goes to a limit that is off by {error:+.2e}", QUANTITIES[i]))
        } else if let Some(said) = self.wrong_in_events() {
            (Verdict::Failed, said)
        } else if suspect.is_some() || finest.iter().any(|rung| !rung.is_outcome_right) {
            (Verdict::Undecided, "the steps are too large to tell the limit".to_owned())
        } else {
            (Verdict::Passed, String::new())
        };
        let answered = last.map(|rung| End {
            outcome: if rung.is_outcome_right { question.exact.outcome } else { other_outcome(question) },
            state: rung.answer,
        });
        Asked {
            id: question.id.clone(),
            contains: question.contains.clone(),
            verdict,
            rtol: None,
            dt_s: last.map(|rung| rung.step),
            expected: expected(question),
            answered,
            relative_error: Some(Each::of(limits.map(|limit| limit.map_or(f64::NAN, |limit| limit.error))))
                .filter(|each| each.depth.is_finite() && each.time.is_finite() && each.velocity.is_finite()),
            limit: None,
            reason,
        }
    }
}

/// The outcome that is not the right one.
fn other_outcome(question: &Question) -> Outcome {
    if question.exact.outcome == Outcome::Perforated { Outcome::Stopped } else { Outcome::Perforated }
}

/// Orders over the questions that pass, and how the ones claimed fare.
fn orders(right: &[(&Question, &[Rung])], identity: &PeerIdentity) -> Vec<QuantityOrder> {
    let claims: &BTreeMap<String, f64> = &identity.claimed_orders;
    let of = |which: usize| {
        let quantity = QUANTITIES[which];
        let formal = claims.get(quantity).or_else(|| claims.get(ORDER_OF_ALL)).copied();
        let errors = pooled(right, which);
        let fitted: Option<OrderFit> = fit(&errors).ok();
        // Large steps may not show the order yet.
        let small = slope(&errors[errors.len() / 2..]);
        let line = fitted.as_ref().and_then(|fitted| fitted.line);
        let is_lower = |formal: f64| Some(is_short_of(formal, line.as_ref()?.interval95, small));
        let verdict = match formal {
            None => Verdict::Skipped,
            Some(formal) => match is_lower(formal) {
                Some(true) => Verdict::Failed,
                Some(false) => Verdict::Passed,
                // No errors above round-off: nothing contradicts the claim.
                None => Verdict::Skipped,
            },
        };
        QuantityOrder {
            quantity,
            formal_order: formal,
            observed_order: line.as_ref().map(|line| line.order),
            interval: line.as_ref().map(|line| line.interval95),
            class: fitted.as_ref().map_or(Class::AtFloor, |fitted| fitted.class),
            verdict,
        }
    };
    [0, 1, 2].map(of).into()
}

/// Whether the whole interval of an order lies below the formal one, and what the smallest steps show does too.
pub(super) fn is_short_of(formal: f64, interval95: [f64; 2], small: Option<f64>) -> bool {
    let is_below = |order: f64| order < (1.0 - ORDER_MARGIN) * formal;
    let [_, high] = interval95;
    is_below(high) && small.is_some_and(is_below)
}

/// The slope of ln error over ln step; `None` for fewer than two errors above zero.
fn slope(errors: &[StepError]) -> Option<f64> {
    let points: Vec<(f64, f64)> =
        errors.iter().filter(|point| point.error > 0.0).map(|point| (point.step.ln(), point.error.ln())).collect();
    let count = points.len() as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let over: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let under: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    Some(over / under).filter(|slope| slope.is_finite())
}

/// Causes of the limits of a solver of fixed steps.
fn fixed_causes(
    laddered: &[Laddered<'_>],
    rows: &[Asked],
    reproducing: &[(Scheme, f64)],
    identity: &PeerIdentity,
    all: &[Question],
) -> Vec<Cause> {
    let others: Vec<&Question> = all.iter().collect();
    let answered = || laddered.iter().zip(rows).filter(|(laddered, _)| laddered.failure.is_none());
    // Step by step, where the passing answers show which scheme it is.
    let mut by_steps = None;
    for (scheme, _) in reproducing.iter().take(3) {
        let mut seen = Vec::new();
        // The coarsest steps of all first, where schemes differ most: a number is fitted to those. The finest would take the longest.
        for part in [0, LADDER.len() / 2] {
            for (laddered, row) in answered().filter(|(_, row)| row.verdict != Verdict::Undecided) {
                let Some(rung) = laddered.rungs.get(part) else { continue };
                let (is_misnamed, is_other) = (laddered.is_misnamed(), !rung.is_outcome_right);
                seen.push(Seen {
                    question: laddered.question,
                    answer: rung.answer,
                    how: How::Scheme(*scheme, rung.step),
                    accuracy: REPRODUCED,
                    fails: row.verdict == Verdict::Failed && (is_other || !is_misnamed),
                    is_misnamed: is_misnamed && is_other,
                });
            }
        }
        let causes = causes(&seen, identity.reads_scene, &others, Effort::Nearly);
        match causes.first().map(|cause| cause.certainty) {
            Some(Certainty::Certain) => return causes,
            Some(Certainty::Likely) => {
                by_steps = Some(causes);
                break;
            }
            Some(Certainty::Possible) | None => {}
        }
    }
    // By the limits, as far as they are known. What is certain there goes before a number of its own in every answer.
    let mut seen = Vec::new();
    for (laddered, row) in answered() {
        let question = laddered.question;
        let limits = laddered.limits();
        let [Some(depth), Some(time), Some(velocity)] = limits else { continue };
        let right = question.exact.end;
        let answer = State {
            depth: right.depth * (1.0 + depth.error),
            time: right.time * (1.0 + time.error),
            velocity: right.velocity + question.problem.impact_speed * velocity.error,
        };
        let sure =
            |i: usize| limits[i].map_or(f64::INFINITY, |limit| 6.0 * limit.standard_error / question.conditions[i]);
        let accuracy = sure(0).max(sure(1)).max(sure(2)).max(1e-9);
        let finest = laddered.rungs.iter().min_by(|a, b| a.step.total_cmp(&b.step));
        let is_misnamed = laddered.is_misnamed();
        // Where the outcome is another, the limit of the numbers may be that of a flight that ends elsewhere.
        let other = finest.filter(|rung| !rung.is_outcome_right && !is_misnamed);
        let answer = other.map_or(answer, |rung| rung.answer);
        if row.verdict == Verdict::Undecided {
            continue;
        }
        seen.push(Seen {
            question,
            answer,
            how: How::Exact,
            accuracy: if other.is_some() { 0.1 } else { accuracy },
            fails: row.verdict == Verdict::Failed,
            is_misnamed,
        });
    }
    let by_limits = causes(&seen, identity.reads_scene, &others, Effort::Pairs);
    let is_certain = by_limits.first().is_some_and(|cause| cause.certainty == Certainty::Certain);
    by_steps.filter(|_| !is_certain).unwrap_or(by_limits)
}

/// Steps (s) and times (s) of the answers whose outcome is wrong.
fn cut_short(laddered: &[Laddered<'_>]) -> Vec<(f64, f64)> {
    let all = laddered.iter().flat_map(|laddered| &laddered.rungs);
    all.filter(|rung| !rung.is_outcome_right).map(|rung| (rung.step, rung.answer.time)).collect()
}

/// Every end is right, and the events listed are not.
fn of_events(laddered: &[Laddered<'_>], rows: &[Asked], failed: usize) -> Option<Cause> {
    let of_lists = rows[laddered.len()..].iter().filter(|row| row.verdict == Verdict::Failed).count();
    let all = laddered.iter().filter(|one| one.wrong_in_events().is_some()).count() + of_lists == failed;
    let first = rows.iter().find(|row| row.verdict == Verdict::Failed)?;
    let statement = format!("every end is right, and the events listed are not: {}", first.reason);
    all.then(|| Cause::plain("event-list", statement, Certainty::Certain, failed, failed))
}

/// Answers that all end after one number of steps, whatever the question, as `cuts` of step and time show.
fn budget(cuts: &[(f64, f64)]) -> Option<Cause> {
    let steps = |(step, time): &(f64, f64)| time / step;
    let first = cuts.first().map(steps)?.round();
    let is_one = cuts.iter().all(|cut| (steps(cut) - first).abs() < 1e-6 * first);
    let statement = format!("the flight ends after {first} steps, wherever it is");
    let of = cuts.len();
    (of >= LEAST_CUTS && is_one && first > 1.0)
        .then(|| Cause::plain("flight-cut-short", statement, Certainty::Likely, of, of))
}

/// Nearly every question that fails has one answer at two steps: a least step, which is not the one asked for.
fn least_step(laddered: &[Laddered<'_>], rows: &[Asked]) -> Option<Cause> {
    let failing: Vec<_> = laddered.iter().zip(rows).filter(|(_, row)| row.verdict == Verdict::Failed).collect();
    let largest = |laddered: &Laddered<'_>| {
        let same = laddered.rungs.windows(2).filter(|pair| pair[0].answer == pair[1].answer);
        same.map(|pair| pair[0].step.max(pair[1].step)).max_by(f64::total_cmp)
    };
    let steps: Vec<f64> = failing.iter().filter_map(|(laddered, _)| largest(laddered)).collect();
    let most = steps.iter().copied().max_by(f64::total_cmp)?;
    let statement = format!("answers at steps below {most:.0e} s are the same: there is a least step");
    let of = failing.len();
    (steps.len() * 10 >= of * 9).then(|| Cause::plain("step-ignored", statement, Certainty::Likely, steps.len(), of))
}

/// The cause of errors that no longer fall with the step, far above the round-off of 64-bit numbers: a few questions are
/// asked again at a far smaller step.
fn floor(asking: &mut Asking<'_>, right: &[(&Question, &[Rung])]) -> Option<Cause> {
    let orders = [0, 1, 2].map(|which| order(right, which).map_or(FLOOR_ORDER, |order| (order - 0.2).max(FLOOR_ORDER)));
    let (mut compared, mut stays, mut largest) = (0, [0; 3], [0.0_f64; 3]);
    let mut cuts = Vec::new();
    for (question, rungs) in right.iter().take(FLOOR_QUESTIONS) {
        let Some(coarsest) = rungs.first() else { continue };
        let asked = PeerRequest { dt_s: Some(FLOOR_STEP * coarsest.step), ..request(question, TOLERANCES[0]) };
        let Ok(answer) = asking.ask(&asked) else { continue };
        let found = errors(end_of(&answer).state, question.exact.end, question.problem.impact_speed);
        compared += 1;
        if found.iter().any(|error| error.abs() > CUT) {
            cuts.push((FLOOR_STEP * coarsest.step, answer.time_s));
        }
        // Of several steps, since one may be right by chance.
        let before = &rung_errors(question, rungs)[LADDER.len() / 2..LADDER.len()];
        let ratio = LADDER[LADDER.len() / 2] / FLOOR_STEP;
        for which in 0..3 {
            let relative = found[which].abs() / question.conditions[which];
            let expected = before.iter().map(|all| all[which].abs()).fold(0.0, f64::max) / ratio.powf(orders[which]);
            if relative > FLOOR_MAX && found[which].abs() > FLOOR_EXCESS * expected {
                stays[which] += 1;
                largest[which] = largest[which].max(relative);
            }
        }
    }
    if let Some(cause) = budget(&cuts) {
        return Some(cause);
    }
    let which = (0..3).max_by_key(|which| stays[*which]).filter(|which| 2 * stays[*which] > compared)?;
    let statement = format!(
        "the error of the {} does not fall below {:.0e} with the step: round-off far above that of 64-bit numbers, as of a \
         sum in single precision",
        QUANTITIES[which], largest[which]
    );
    Some(Cause::plain("round-off", statement, Certainty::Likely, stays[which], compared))
}

/// What lowers the order of a sound scheme: of one that reproduces the answers, its rules; of another, what the questions of
/// order one have in common.
fn what_lowers(scheme: Option<Scheme>, right: &[(&Question, &[Rung])], orders: &[QuantityOrder]) -> Vec<Cause> {
    let of = right.len();
    if let Some(scheme) = scheme {
        return rules_that_lower(scheme, right);
    }
    let first_order = orders.iter().any(|order| order.observed_order.is_some_and(|order| order < 1.5));
    if !first_order {
        let below = orders.iter().find(|order| order.verdict == Verdict::Failed);
        let cause = below.map(|below| {
            let (found, claimed) = (below.observed_order.unwrap_or(0.0), below.formal_order.unwrap_or(0.0));
            let alone = of_depth_alone(right, claimed);
            alone.or_else(|| where_it_falls(right, claimed, true).into_iter().next()).unwrap_or_else(|| {
                let statement =
                    format!("the order of the {} is {found:.1} over all questions, not {claimed}", below.quantity);
                Cause::plain("order", statement, Certainty::Likely, of, of)
            })
        });
        return cause.into_iter().collect();
    }
    let is_first = |which: usize| order(right, which).map(|order| order < 1.5);
    if is_first(1) == Some(true) && [0, 2].iter().all(|which| is_first(*which) != Some(true)) {
        let (behind, alone): (Vec<_>, Vec<_>) =
            right.iter().copied().partition(|(question, _)| question.contains.contains(&Content::StageEnd));
        if order(&alone, 1).is_some_and(|order| order > SECOND - KEPT)
            && order(&behind, 1).is_some_and(|order| order < 1.5)
        {
            let statement = "the time alone has order 1, and only behind the end of a stage: the clock goes on from the end of the step \
                             that passes it, not from the end of the stage";
            return vec![Cause::plain("clock", statement.to_owned(), Certainty::Likely, behind.len(), of)];
        }
        let errors = right.iter().flat_map(|(question, rungs)| rung_errors(question, rungs));
        let (id, statement) = if errors.map(|[_, time, _]| time).sum::<f64>() > 0.0 {
            ("event-time-late", "the time alone has order 1: it is that of the end of a step")
        } else {
            (
                "event-time-early",
                "the time alone has order 1, and is too small: that of a shortened step is not counted",
            )
        };
        return vec![Cause::plain(id, statement.to_owned(), Certainty::Likely, of, of)];
    }
    if right.iter().flat_map(|(_, rungs)| *rungs).all(Rung::is_of_whole_steps) {
        let statement = "every flight ends at the end of a step: exit and rest are not located, order 1".to_owned();
        return vec![Cause::plain("exit-late", statement, Certainty::Certain, of, of)];
    }
    let mut causes = where_it_falls(right, SECOND, false);
    if causes.is_empty() {
        let statement = "the order is about 1 in questions of every kind".to_owned();
        causes.push(Cause::plain("first-order-scheme", statement, Certainty::Likely, of, of));
    }
    causes
}

/// Whether x has a lower order than V: flights to rest under forces of V alone show it.
fn of_depth_alone(right: &[(&Question, &[Rung])], full: f64) -> Option<Cause> {
    const OF_DEPTH: [Content; 4] = [Content::Stiffness, Content::LaterStiffness, Content::Softening, Content::StageEnd];
    let is_of_speed = |question: &Question| {
        question.contains.contains(&Content::Rest)
            && !OF_DEPTH.iter().any(|content| question.contains.contains(content))
    };
    let alone: Vec<(&Question, &[Rung])> =
        right.iter().copied().filter(|(question, _)| is_of_speed(question)).collect();
    let depth = order(&alone, 0)?;
    // Under a constant force V is exact, and so is the time.
    let keeps = order(&alone, 1).is_none_or(|order| order > full - KEPT);
    let statement = format!(
        "the order of the depth alone falls to {depth:.0}, where the force does not depend on x and the time keeps its order: x is \
         advanced by a rule of a lower order than V"
    );
    (depth < full - LOST && keeps)
        .then(|| Cause::plain("order", statement, Certainty::Likely, alone.len(), right.len()))
}

/// Kinds of questions to which the order `full` is lost, where others keep it: two at most.
fn where_it_falls(right: &[(&Question, &[Rung])], full: f64, is_high: bool) -> Vec<Cause> {
    let mut causes = Vec::new();
    for Lowering { id, contents, place, of_one, of_more } in LOWERS {
        if causes.len() == 2 || (*id == "start-kick" && !causes.is_empty()) {
            break;
        }
        let holds = |question: &Question| question.contains.iter().any(|content| contents.contains(content));
        let part = |is_with: bool| -> Vec<(&Question, &[Rung])> {
            right.iter().copied().filter(|(question, _)| holds(question) == is_with).collect()
        };
        let lowest =
            |part: &[(&Question, &[Rung])]| (0..3).filter_map(|which| order(part, which)).fold(f64::INFINITY, f64::min);
        let (inside, outside) = (part(true), part(false));
        if inside.is_empty() || outside.is_empty() {
            continue;
        }
        let (found, beside) = (lowest(&inside), lowest(&outside));
        if found < full - LOST && beside > full - KEPT {
            let (id, why) = if is_high { ("order", *of_more) } else { (*id, *of_one) };
            let statement = format!("the order falls to {found:.0} {place}{why}");
            causes.push(Cause::plain(id, statement, Certainty::Likely, inside.len(), right.len()));
        }
    }
    causes.dedup_by(|a, b| a.id == b.id);
    causes
}

/// What lowers an order, where every question of the lower one holds one of the contents.
struct Lowering {
    /// Id where the order falls to one.
    id: &'static str,
    contents: &'static [Content],
    /// Where it falls.
    place: &'static str,
    /// Why, to one, and to more.
    of_one: &'static str,
    of_more: &'static str,
}

const LOWERS: &[Lowering] = &[
    Lowering {
        id: "drag-lagged",
        contents: &[Content::Drag],
        place: "where there is drag, and not with viscosity alone",
        of_one: ": its V², or a derivative of it, is that of another time",
        of_more: ": its V² is not that of the scheme's stage",
    },
    Lowering {
        id: "drag-lagged",
        contents: &[Content::Drag, Content::Viscosity],
        place: "where the force depends on V",
        of_one: "",
        of_more: ": its V is not that of the scheme's stage",
    },
    Lowering {
        id: "force-stale",
        contents: &[Content::Stiffness, Content::LaterStiffness, Content::Softening],
        place: "where the force depends on x",
        of_one: ": its depth is that of another time",
        of_more: ": its depth is not that of the scheme's stage",
    },
    Lowering {
        id: "stage-end-late",
        contents: &[Content::ForceJump],
        place: "where the force jumps at the end of a stage",
        of_one: "",
        of_more: ": that end is not located to the order of the scheme",
    },
    Lowering {
        id: "stage-end-late",
        contents: &[Content::StageEnd],
        place: "where the end of a stage is passed",
        of_one: "",
        of_more: ": it is not located to the order of the scheme, or the step to it is of a lower one",
    },
    Lowering {
        id: "exit-late",
        contents: &[Content::Exit],
        place: "at the exit",
        of_one: "",
        of_more: ": it is not located to the order of the scheme, or the step to it is of a lower one",
    },
    Lowering {
        id: "stage-end-late",
        contents: &[Content::StageEnd, Content::Exit],
        place: "at ends of stages and at the exit",
        of_one: ": a step that passes one is taken whole",
        of_more: ": they are not located to the order of the scheme, or the step to them is of a lower one",
    },
    Lowering {
        id: "rest-late",
        contents: &[Content::Rest],
        place: "at rest",
        of_one: ": it is taken at a step",
        of_more: ": it is not located to the order of the scheme",
    },
    Lowering {
        id: "start-kick",
        contents: &[Content::StaticForce, Content::Drive, Content::Viscosity, Content::Drag],
        place: "where there is a force at impact",
        of_one: ": V half a step back is V0 itself",
        of_more: "",
    },
];

/// The rules of a known scheme that lower its order.
fn rules_that_lower(scheme: Scheme, right: &[(&Question, &[Rung])]) -> Vec<Cause> {
    let with = |content: Content| right.iter().filter(|(question, _)| question.contains.contains(&content)).count();
    let certain = |id: &str, statement: String, explains: usize| {
        Cause::plain(id, statement, Certainty::Certain, explains, right.len())
    };
    let mut causes = Vec::new();
    if scheme.velocity() == Some(VelocityAt::LaggedHalfStep) && with(Content::Drag) + with(Content::Viscosity) > 0 {
        let statement = "the force is evaluated with V half a step behind: order 1 wherever it depends on V".to_owned();
        causes.push(certain("drag-lagged", statement, with(Content::Drag).max(with(Content::Viscosity))));
    }
    let of_name = match scheme.name() {
        "euler" => Some(("first-order-scheme", "the scheme is forward Euler, of order 1")),
        "semi-implicit-euler" => Some((
            "start-kick",
            "the scheme is semi-implicit Euler, of order 1: central difference started without its first half step of V is the same",
        )),
        _ => None,
    };
    causes.extend(of_name.map(|(id, statement)| certain(id, statement.to_owned(), right.len())));
    if scheme.events() == Boundaries::StepEnd {
        for (id, content, what) in [
            ("stage-end-late", Content::StageEnd, "the end of a stage"),
            ("exit-late", Content::Exit, "the exit"),
            ("rest-late", Content::Rest, "rest"),
        ] {
            if with(content) > 0 {
                let statement = format!("{what} is taken at the end of the step that passes it: order 1");
                causes.push(certain(id, statement, with(content)));
            }
        }
    }
    causes
}
