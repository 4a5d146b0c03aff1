//! Is a solver right that takes a tolerance, and if not, what explains its answers?
//!
//! It is asked at three tolerances. An answer may err by [`ALLOWED`] times the tolerance and the condition of the problem.
//! Causes are looked for while it is asked, from the exact answers to ever greater errors, so that small errors of
//! everything do not hide a great one of something.

use strum::IntoEnumIterator;

use super::causes::{CERTAIN_FROM, Cause, Certainty, Effort, Seen, causes};
use super::hypotheses::How;
use super::numbers::{few_digits, is_cut_off, same_answer};
use super::observations::{is_one_error, is_same, shown};
use super::questions::{Content, Question};
use super::{
    ALLOWED, Answered, Asked, Asking, Diagnosis, Each, QUANTITIES, Subject, TOLERANCES, count, end_of, expected,
    finish, request,
};
use crate::exchange::peers::wire::{conditioning, errors};
use crate::exchange::peers::{PeerAnswer, PeerIdentity, PeerRequest};
use crate::integrators::{Detail, Enclosure};
use crate::physics::{Event, Outcome, Problem, Shown, State};
use crate::studies::enclosure;
use crate::studies::verdict::Verdict;

/// Questions after which causes are looked for, and after which a certain one ends the asking.
const LOOKED_FROM: usize = 80;
/// Questions between two looks.
const LOOKED_EACH: usize = 40;
/// Accuracies (relative error over the condition) of a solver that does not do what it is asked for.
const ACCURACIES: [f64; 4] = [1e-9, 1e-7, 1e-5, 1e-3];

/// Part of its error at the loosest tolerance that an answer has left at the tightest, where the scheme and not the equation is wrong:
/// a long series takes hardly shorter steps then.
const FALLEN: f64 = 0.5;
/// Part of its error by which an answer changes at most where the tolerance is not kept.
const FLOOR_SPREAD: f64 = 0.1;

/// How an answer of an adaptive solver fares.
struct Judged {
    verdict: Verdict,
    errors: [f64; 3],
    limits: [f64; 3],
    reason: String,
    /// Whether only its outcome is wrong.
    is_misnamed: bool,
    /// Whether only the events listed are.
    is_in_events: bool,
}

/// Diagnosis of a solver that takes a tolerance.
pub(super) fn at_tolerances(
    asking: &mut Asking<'_>,
    peer: Subject,
    identity: &PeerIdentity,
    all: &[Question],
    progress: &dyn Fn(usize, usize),
) -> Diagnosis {
    let mut answered: Vec<Answered<'_>> = Vec::new();
    let mut found = Vec::new();
    for (index, question) in all.iter().enumerate() {
        answered.push(asking.at_tolerances(question));
        progress(index + 1, all.len());
        let asked = index + 1;
        if asking.is_gone {
            break;
        }
        if asked >= LOOKED_FROM && asked % LOOKED_EACH == 0 && asked < all.len() {
            found = causes_of(&answered, identity, all, Effort::All);
            if found.first().is_some_and(|cause| cause.certainty == Certainty::Certain) {
                break;
            }
        }
    }
    let asked: Vec<Asked> = answered.iter().map(row).collect();
    let counts = count(&asked, all.len());
    let verdict = match () {
        () if counts.failed > 0 => Verdict::Failed,
        () if counts.passed == 0 => Verdict::Undecided,
        () => Verdict::Passed,
    };
    if verdict == Verdict::Failed && found.first().is_none_or(|cause| cause.certainty != Certainty::Certain) {
        found = causes_of(&answered, identity, all, Effort::Pairs);
    }
    if verdict != Verdict::Failed {
        found = floor(&answered).filter(|_| verdict == Verdict::Passed).into_iter().collect();
    }
    finish(Diagnosis {
        verdict,
        peer,
        counts,
        causes: found,
        scheme: None,
        orders: Vec::new(),
        separation: None,
        questions: asked,
    })
}

/// The row of a question at tolerances: the tightest answer that fails, else the tightest.
pub(super) fn row(answered: &Answered<'_>) -> Asked {
    let question = answered.question;
    let mut asked = Asked {
        id: question.id.clone(),
        contains: question.contains.clone(),
        verdict: Verdict::Skipped,
        rtol: None,
        dt_s: None,
        expected: expected(question),
        answered: None,
        relative_error: None,
        limit: None,
        reason: String::new(),
    };
    for (rtol, answer) in &answered.answers {
        match answer {
            Err(why) => {
                asked.verdict = Verdict::Failed;
                if asked.reason.is_empty() {
                    asked.reason.clone_from(why);
                    asked.rtol = Some(*rtol);
                    // Those at other tolerances are right.
                    (asked.answered, asked.relative_error, asked.limit) = (None, None, None);
                }
            }
            Ok(answer) => {
                let judged = judge(question, *rtol, answer);
                let is_shown = match judged.verdict {
                    Verdict::Failed => true,
                    Verdict::Passed => asked.verdict != Verdict::Failed,
                    _ => false,
                };
                if is_shown {
                    asked.verdict = judged.verdict;
                    asked.rtol = Some(*rtol);
                    asked.answered = Some(end_of(answer));
                    asked.relative_error = Some(Each::of(judged.errors));
                    asked.limit = Some(Each::of(judged.limits));
                    asked.reason = judged.reason;
                }
            }
        }
    }
    asked
}

fn judge(question: &Question, rtol: f64, answer: &PeerAnswer) -> Judged {
    let (problem, exact) = (&question.problem, &question.exact);
    let end = State { time: answer.time_s, depth: answer.depth_m, velocity: answer.velocity_m_s };
    let errors = errors(end, exact.end, problem.impact_speed);
    let asked = request(question, rtol);
    let absolute = if exact.end.depth > 0.0 { asked.atol[0] / exact.end.depth } else { 0.0 };
    let conditions = conditioning(exact.end, problem);
    let limits: [f64; 3] =
        std::array::from_fn(|i| ALLOWED * (rtol + absolute.min(1.0)) * conditions[i].max(question.conditions[i]));
    let judged = |verdict, reason: String, is_misnamed| Judged {
        verdict,
        errors,
        limits,
        reason,
        is_misnamed,
        is_in_events: false,
    };
    let in_events = |reason: String| Judged { is_in_events: true, ..judged(Verdict::Failed, reason, false) };
    let are_right = (0..3).all(|i| errors[i].abs() <= limits[i]);
    if !answer.outcome.agrees_with(exact.outcome) {
        // What is allowed of V, relative, is twice as much of the margin, of which the tolerance itself is allowed too.
        let allowed = |margin: f64| ALLOWED * rtol + 2.0 * limits[2] * margin;
        let is_open = exact.exit_margin.is_some_and(|margin| margin.abs() <= allowed(margin.abs()));
        if is_open {
            return judged(Verdict::Skipped, String::new(), false);
        }
        let exit =
            if problem.has_exit() { format!(", the exit at {:.9} m", problem.exit_depth) } else { String::new() };
        let said = format!(
            "says {} at x = {:.9} m, V = {:.6} m/s{exit}; {} is right",
            answer.outcome, end.depth, end.velocity, exact.outcome
        );
        return judged(Verdict::Failed, said, are_right);
    }
    if let Some(worst) = (0..3)
        .filter(|i| !(errors[*i].abs() <= limits[*i]))
        .max_by(|a, b| (errors[*a].abs() / limits[*a]).total_cmp(&(errors[*b].abs() / limits[*b])))
    {
        let said = format!("{} off by {:+.2e}, limit {:.1e}", QUANTITIES[worst], errors[worst], limits[worst]);
        let proof = proof(problem, worst, end).map_or_else(String::new, |proof| format!("; {proof}"));
        return judged(Verdict::Failed, said + &proof, false);
    }
    // An end that is reached with next to no speed is reached or not within the tolerance.
    let worst_limit = limits.iter().copied().fold(0.0, f64::max);
    let is_open = |event: &Event| (event.state.velocity / problem.impact_speed).powi(2) <= worst_limit;
    if let Some(said) = wrong_list(question, &asked, answer, is_open) {
        return in_events(said);
    }
    // The time at which next to no speed is left is known to the root of the tolerance.
    let mut sure = answer.clone();
    sure.events.retain(|event| !is_open(event));
    let listed = sure.differences_from(exact, problem).unwrap_or_default();
    let off = listed.iter().find(|difference| !(difference.relative <= 10.0 * worst_limit * difference.conditioning));
    if let Some(difference) = off {
        let said = format!("the event listed is off: {} by {:+.2e}", difference.quantity, difference.signed);
        return in_events(said);
    }
    judged(Verdict::Passed, String::new(), false)
}

/// What is wrong with the list of events of `answer`, whatever their numbers; events that are open may be left out.
pub(super) fn wrong_list(
    question: &Question,
    asked: &PeerRequest,
    answer: &PeerAnswer,
    is_open: impl Fn(&Event) -> bool,
) -> Option<String> {
    if !answer.has_events_in_order(asked) {
        return Some("the events listed are not of the stages, each once, in the order of time".to_owned());
    }
    let event = answer.left_out(&question.exact, &question.problem).filter(|event| !is_open(event))?;
    Some(format!("lists events, and not the {} at x = {:.9} m", event.kind.name(), event.state.depth))
}

/// What is proved of the answer's quantity `index` of [`QUANTITIES`]; the numbers of a question are exact.
fn proof(problem: &Problem, index: usize, end: State) -> Option<String> {
    let flight = Enclosure.enclose(&problem.cast(), Detail::End).ok()?;
    let (value, ball, unit) = [
        (end.depth, flight.end.depth, "m"),
        (end.time, flight.end.time, "s"),
        (end.velocity, flight.end.velocity, "m/s"),
    ][index];
    let is_proved = flight.outcome != Outcome::Undecided;
    let said =
        || enclosure::sentence(&Shown(value).to_string(), value, 0.0, (ball.lower().max(0.0), ball.upper()), unit);
    is_proved.then(said).flatten()
}

/// The ends of all answers that came, at the tightest tolerance, and the exact ones.
fn ends_and_exact(answered: &[Answered<'_>]) -> Vec<(State, State)> {
    let end = |one: &Answered<'_>| Some(end_of(one.answers.last()?.1.as_ref().ok()?).state);
    answered.iter().filter_map(|one| Some((end(one)?, one.question.exact.end))).collect()
}

/// The ends of all answers that came, at the tightest tolerance.
fn ends(answered: &[Answered<'_>]) -> impl Iterator<Item = State> {
    ends_and_exact(answered).into_iter().map(|(end, _)| end)
}

/// That all questions have one answer, which enough of them have.
fn of_one_answer(answered: &[Answered<'_>], failed: usize) -> Option<Cause> {
    let all: Vec<State> = ends(answered).collect();
    (all.len() >= LOOKED_EACH && all.len() == answered.len()).then(|| same_answer(all.into_iter(), failed)).flatten()
}

/// Whether nearly all that fail have no answer: the few answers then say little.
fn is_mostly(silent: usize, failed: usize) -> bool {
    10 * silent >= 9 * failed
}

/// That questions have no answer: so many of those that fail.
fn no_answer(rows: &[Asked], silent: usize, failed: usize) -> Cause {
    let is_silent = |row: &Asked| row.verdict == Verdict::Failed && row.answered.is_none();
    let words = rows.iter().find(|row| is_silent(row)).map_or("", |row| row.reason.as_str());
    let statement = format!(
        "{} no answer: {words}{}",
        if silent == 1 { "1 question has".to_owned() } else { format!("{silent} questions have") },
        of_all(rows, is_silent).map_or_else(String::new, |content| format!("; all of them hold `{content}`"))
    );
    let certainty = if is_mostly(silent, failed) { Certainty::Likely } else { Certainty::Possible };
    Cause::plain("no-answer", statement, certainty, silent, failed)
}

/// Causes of the answers of an adaptive solver. What it makes of a projectile without speed is judged by itself: that is no flight.
fn causes_of(answered: &[Answered<'_>], identity: &PeerIdentity, all: &[Question], effort: Effort) -> Vec<Cause> {
    let is_wrong = |one: &&Answered<'_>| {
        let row = row(one);
        row.verdict == Verdict::Failed && row.answered.is_some()
    };
    let (standing, flights): (Vec<&Answered<'_>>, Vec<&Answered<'_>>) =
        answered.iter().partition(|one| one.question.problem.impact_speed == 0.0);
    let wrong = standing.iter().copied().filter(is_wrong).count();
    if wrong == 0 {
        return causes_of_flights(answered, identity, all, effort);
    }
    let flights: Vec<Answered<'_>> = flights.into_iter().cloned().collect();
    let mut found = causes_of_flights(&flights, identity, all, effort);
    let statement = "a projectile without speed is not left at rest on the face, at t = 0".to_owned();
    let fail = flights.iter().any(|one| row(one).verdict == Verdict::Failed);
    let certainty = if fail { Certainty::Possible } else { Certainty::Likely };
    found.push(Cause::plain("no-speed", statement, certainty, wrong, wrong));
    found
}

/// The same where each question is a flight, or a projectile without speed is left alone.
fn causes_of_flights(
    answered: &[Answered<'_>],
    identity: &PeerIdentity,
    all: &[Question],
    effort: Effort,
) -> Vec<Cause> {
    let rows: Vec<Asked> = answered.iter().map(row).collect();
    let failed = rows.iter().filter(|row| row.verdict == Verdict::Failed).count();
    let silent = rows.iter().filter(|row| row.verdict == Verdict::Failed && row.answered.is_none()).count();
    if failed == 0 {
        return Vec::new();
    }
    if let Some(cause) = of_one_answer(answered, failed).or_else(|| of_events(answered, failed)) {
        return vec![cause];
    }
    let others: Vec<&Question> = all.iter().collect();
    let of_numbers = few_digits(ends(answered), failed);
    let at = |accuracy: f64| seen(answered, |_| accuracy);
    let failing = |seen: &[Seen<'_>]| seen.iter().filter(|seen| seen.fails).count();
    let named = |seen: &[Seen<'_>], effort: Effort| {
        let found = causes(seen, identity.reads_scene, &others, effort);
        found.first().is_some_and(|cause| cause.certainty != Certainty::Possible).then_some(found)
    };
    let no_answer = (silent > 0).then(|| no_answer(&rows, silent, failed));
    let exactly = at(ACCURACIES[0]);
    let mut found = named(&exactly, if effort == Effort::All { effort } else { Effort::Nearly });
    let is_certain = |found: &[Cause]| found.first().is_some_and(|cause| cause.certainty == Certainty::Certain);
    if let Some(cause) = &of_numbers
        && silent == 0
        && !found.as_deref().is_some_and(is_certain)
        && is_cut_off(&ends_and_exact(answered), ACCURACIES[0])
    {
        return vec![Cause { certainty: Certainty::Certain, ..cause.clone() }];
    }
    // Small errors alone are those of a solver that does not do what the tolerance asks for, unless they are in few
    // answers, and those are sure of themselves.
    let is_of_few = 2 * failed < rows.len() && are_sure(answered);
    if found.is_none()
        && !is_of_few
        && 10 * silent <= failed
        && failing(&at(ACCURACIES[3])) == 0
        && failing(&exactly) > 0
    {
        let same = answered.iter().filter(|one| is_same(one)).count();
        return vec![of_numbers.unwrap_or_else(|| {
            if answered.len() >= 10 && same * 10 >= answered.len() * 9 {
                let statement = "answers are the same at every tolerance, and err by more than it allows".to_owned();
                // A small fault of the force in a solver that is exact looks alike.
                Cause::plain("tolerance-ignored", statement, Certainty::Likely, failed, failed)
            } else {
                inaccurate(answered, &rows, failed)
            }
        })];
    }
    let is_small = |seen: &[Seen<'_>]| 10 * failing(seen) <= failing(&exactly);
    if found.is_none()
        && !is_of_few
        && silent == 0
        && is_small(&at(ACCURACIES[3]))
        && answered.iter().zip(&rows).filter(|(one, row)| row.verdict == Verdict::Failed && is_one_error(one)).count()
            * 10
            >= failed * 9
    {
        let statement = "answers are nearly the same at every tolerance, and err by more than it allows".to_owned();
        return vec![Cause::plain("tolerance-ignored", statement, Certainty::Likely, failed, failed)];
    }
    if found.is_none() && converges(answered) {
        return vec![inaccurate(answered, &rows, failed)];
    }
    if effort == Effort::All {
        return found.unwrap_or_default();
    }
    // An input that is off a little, in every answer by another factor, is what an inaccurate solver looks like.
    let as_likely = |mut causes: Vec<Cause>| {
        for cause in &mut causes {
            cause.certainty = cause.certainty.max(Certainty::Likely);
        }
        (causes.first()?.id != "input-rounded").then_some(causes)
    };
    // To within what its answers at two tolerances differ by, unless the numbers themselves say why they differ.
    if found.is_none() && of_numbers.is_none() {
        found = named(&seen(answered, |one| spread(one).max(ACCURACIES[0])), Effort::Nearly).and_then(as_likely);
    }
    let beside = of_numbers.map(|cause| Cause { certainty: Certainty::Possible, ..cause });
    // Behind small errors of everything there may be a great one of something.
    let mut before = failing(&exactly);
    for accuracy in &ACCURACIES[1..] {
        let seen = at(*accuracy);
        let now = failing(&seen);
        if found.is_none() && now > 0 && 10 * now < 9 * before {
            before = now;
            let is_of_enough = |causes: &Vec<Cause>| causes.first().is_some_and(|cause| 4 * cause.of >= failed);
            found = named(&seen, Effort::Nearly).and_then(as_likely).filter(is_of_enough).map(|mut causes| {
                causes.extend(beside.clone());
                causes
            });
        }
    }
    if found.is_none() && effort == Effort::Pairs {
        found = named(&exactly, Effort::Pairs);
    }
    if found.is_none() && silent == 0 {
        let judged: Vec<_> = answered.iter().zip(rows.iter().map(|row| row.verdict == Verdict::Failed)).collect();
        found = shown(&judged).map(|cause| vec![cause]);
    }
    let mut found = found.unwrap_or_else(|| {
        let possible = causes(&exactly, identity.reads_scene, &others, Effort::Some);
        beside.into_iter().chain(possible).collect()
    });
    let place = if is_mostly(silent, failed) && !is_certain(&found) { 0 } else { found.len() };
    found.splice(place..place, no_answer);
    found
}

/// Right answers that are nearly the same at the two tightest tolerances, with errors that the tightest would lessen.
fn floor(answered: &[Answered<'_>]) -> Option<Cause> {
    let tight = TOLERANCES[TOLERANCES.len() - 1];
    // The absolute tolerance of each may leave a little between them.
    let improvable = answered.iter().filter_map(|one| {
        let [.., (_, Ok(_)), (_, Ok(last))] = &one.answers[..] else { return None };
        let error = one.question.over_condition(judge(one.question, tight, last).errors);
        (error > 10.0 * tight).then_some((error, spread(one) < FLOOR_SPREAD * error))
    });
    let improvable: Vec<(f64, bool)> = improvable.collect();
    let same = improvable.iter().filter(|(_, is_same)| *is_same).count();
    let worst = improvable.iter().map(|(error, _)| *error).fold(0.0, f64::max);
    let statement =
        format!("answers at tolerances of 1e-9 and 1e-12 are as good as the same, with errors up to {worst:.0e}");
    let is_floor = same >= 10 && same * 10 >= improvable.len() * 9;
    is_floor.then(|| Cause::plain("tolerance-ignored", statement, Certainty::Likely, same, answered.len()))
}

/// What every question of which `is_one` holds, and few others do.
fn of_all(rows: &[Asked], is_one: impl Fn(&Asked) -> bool) -> Option<Content> {
    let (these, others): (Vec<&Asked>, Vec<&Asked>) = rows.iter().partition(|row| is_one(row));
    let count = |rows: &[&Asked], content| rows.iter().filter(|row| row.contains.contains(&content)).count();
    let stands_in_all = |content: &Content| count(&these, *content) == these.len();
    Content::iter()
        .filter(stands_in_all)
        .map(|content| (count(&others, content), content))
        .min_by_key(|(count, _)| *count)
        .filter(|(count, _)| 2 * count <= others.len())
        .map(|(_, content)| content)
}

/// Every end is right, and the events listed are not.
fn of_events(answered: &[Answered<'_>], failed: usize) -> Option<Cause> {
    let failing = answered.iter().filter_map(|Answered { question, answers }| {
        let judge = |(rtol, answer): &(f64, Result<PeerAnswer, String>)| match answer {
            Ok(answer) => Some(judge(question, *rtol, answer)).filter(|judged| judged.verdict == Verdict::Failed),
            Err(_) => None,
        };
        answers.iter().rev().find_map(judge)
    });
    let failing: Vec<Judged> = failing.collect();
    let first = failing.first()?;
    let statement = format!("every end is right, and the events listed are not: {}", first.reason);
    let all = failing.len() == failed && failing.iter().all(|judged| judged.is_in_events);
    let certainty = if failed >= CERTAIN_FROM { Certainty::Certain } else { Certainty::Likely };
    all.then(|| Cause::plain("event-list", statement, certainty, failed, failed))
}

/// Whether most failing answers differ far less between the two tightest tolerances than from the right ones.
fn are_sure(answered: &[Answered<'_>]) -> bool {
    let (mut sure, mut all) = (0, 0);
    for one in answered {
        let Some((rtol, Ok(answer))) = one.answers.last() else { continue };
        let judged = judge(one.question, *rtol, answer);
        if judged.verdict == Verdict::Failed && !judged.is_in_events {
            let error = one.question.over_condition(judged.errors);
            all += 1;
            sure += usize::from(spread(one) < 0.1 * error);
        }
    }
    2 * sure > all
}

/// Whether the errors of failing answers fall with the tolerance, as those of no wrong equation do.
fn converges(answered: &[Answered<'_>]) -> bool {
    let (mut fall, mut all) = (0, 0);
    for Answered { question, answers } in answered {
        let error = |which: usize| {
            let (rtol, answer) = answers.get(which)?;
            let judged = judge(question, *rtol, answer.as_ref().ok()?);
            let error = question.over_condition(judged.errors);
            Some((error, judged.verdict == Verdict::Failed))
        };
        // Where the loosest answer is as good as it should be, the steps are bounded by something else.
        if let (Some((loose, _)), Some((tight, true))) = (error(0), error(TOLERANCES.len() - 1))
            && loose.max(tight) > TOLERANCES[0]
        {
            all += 1;
            fall += usize::from(tight < FALLEN * loose);
        }
    }
    all > 0 && 2 * fall >= all
}

/// The answers that came, an answer failing where it is beyond its limit and off by more than `accuracy`.
fn seen<'a>(answered: &[Answered<'a>], accuracy: impl Fn(&Answered<'a>) -> f64) -> Vec<Seen<'a>> {
    let mut all = Vec::new();
    // Without speed there is nothing to simulate.
    let is_usable = |question: &Question| question.problem.impact_speed > 0.0 && !question.is_on_a_border();
    for one in answered.iter().filter(|one| is_usable(one.question)) {
        let Answered { question, answers } = one;
        let accuracy = accuracy(one);
        // The tightest answer that fails, else the tightest.
        let mut chosen: Option<Seen<'_>> = None;
        for (rtol, answer) in answers {
            let Ok(answer) = answer else { continue };
            let judged = judge(question, *rtol, answer);
            if judged.verdict == Verdict::Skipped {
                continue;
            }
            let of_answer = (ALLOWED * rtol).max(accuracy);
            let is_far = (0..3).any(|i| !(judged.errors[i].abs() <= of_answer * question.conditions[i]));
            let fails = judged.verdict == Verdict::Failed && (is_far || judged.is_misnamed);
            if fails || chosen.as_ref().is_none_or(|chosen| !chosen.fails) {
                chosen = Some(Seen {
                    question,
                    answer: end_of(answer).state,
                    how: How::Exact,
                    accuracy: of_answer,
                    fails,
                    is_misnamed: judged.is_misnamed,
                });
            }
        }
        all.extend(chosen);
    }
    all
}

/// How far the answers at the two tightest tolerances lie apart, over the condition.
fn spread(Answered { question, answers }: &Answered<'_>) -> f64 {
    let ends: Vec<State> =
        answers.iter().rev().filter_map(|(_, answer)| Some(end_of(answer.as_ref().ok()?).state)).collect();
    let [tight, looser, ..] = ends[..] else { return 0.0 };
    let apart = errors(looser, tight, question.problem.impact_speed);
    let relative = question.over_condition(apart);
    if relative.is_finite() { relative } else { 0.0 }
}

/// The quantity that alone is beyond its limit in the failing answers.
fn alone_wrong(answered: &[Answered<'_>]) -> Option<&'static str> {
    let mut wrong = [false; 3];
    for Answered { question, answers } in answered {
        for (rtol, answer) in answers.iter().filter_map(|(rtol, answer)| Some((*rtol, answer.as_ref().ok()?))) {
            let judged = judge(question, rtol, answer);
            if judged.verdict == Verdict::Failed {
                (0..3).for_each(|i| wrong[i] |= !(judged.errors[i].abs() <= judged.limits[i]));
            }
        }
    }
    let all: Vec<usize> = (0..3).filter(|i| wrong[*i]).collect();
    if let [only] = all[..] { Some(QUANTITIES[only]) } else { None }
}

/// The cause of errors that are small, and beyond the tolerance.
fn inaccurate(answered: &[Answered<'_>], rows: &[Asked], failed: usize) -> Cause {
    let failing = || answered.iter().zip(rows).filter(|(_, row)| row.verdict == Verdict::Failed).map(|(one, _)| one);
    // Errors over the condition at each tolerance.
    let usual = |which: usize| {
        let mut all: Vec<f64> = failing()
            .filter_map(|Answered { question, answers }| {
                let (rtol, answer) = answers.get(which)?;
                let judged = judge(question, *rtol, answer.as_ref().ok()?);
                Some(question.over_condition(judged.errors))
            })
            .collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() * 3 / 4).copied().unwrap_or(0.0)
    };
    let errors = [0, 1, 2].map(usual);
    let alike = answered.iter().filter(|one| is_one_error(one)).count();
    // Where the two tightest tolerances give nearly one answer, no noise of few digits is in it.
    let stays = errors[2] > 0.3 * errors[0] && (errors[2] > 1e-6 || 2 * alike > answered.len())
        || errors[2] > 0.3 * errors[1] && are_sure(answered);
    let rises = errors[2] > 0.3 * errors[1] && (1e-8..1e-4).contains(&errors[2]);
    let [loose, middle, tight] = errors.map(|error| format!("{error:.0e}"));
    let alone = alone_wrong(answered).map_or_else(String::new, |quantity| format!(" in the {quantity} alone,"));
    let found = format!("errors of {loose}, {middle} and {tight},{alone} at tolerances of 1e-6, 1e-9 and 1e-12");
    if stays {
        let statement = format!("{found}: they do not follow the tolerance");
        Cause::plain("tolerance-ignored", statement, Certainty::Likely, failed, failed)
    } else if rises {
        let statement = format!("{found}: they stop falling far above the round-off of 64-bit numbers");
        Cause::plain("single-precision", statement, Certainty::Likely, failed, failed)
    } else {
        // A thousandth of the tolerance between each two.
        let power = (errors[0] / errors[2]).log10() / (TOLERANCES[0] / TOLERANCES[2]).log10();
        let falls = if power.is_finite() && power > 0.05 && power < 0.9 {
            format!(
                "they fall as the tolerance to the power of {power:.1}, as with a wrong coefficient of the scheme, or \
                 events that are located less accurately than steps are taken"
            )
        } else {
            "the error is not what the tolerance asks for".to_owned()
        };
        let holds = of_all(rows, |row| row.verdict == Verdict::Failed)
            .map_or_else(String::new, |content| format!("; all that fail hold `{content}`"));
        let statement = format!("{found}: {falls}{holds}");
        Cause::plain("tolerance-missed", statement, Certainty::Likely, failed, failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::diagnosis::faulty;
    use crate::studies::diagnosis::questions::questions;

    #[test]
    fn the_numbers_of_an_event_that_is_passed_slowly_have_its_conditioning_for_a_limit() {
        const RTOL: f64 = 1e-9;
        let mut slow = 0;
        for question in questions(1, 400, false) {
            let (problem, exact) = (&question.problem, &question.exact);
            let Some(index) = exact.events.iter().position(|event| {
                let share = event.state.velocity / problem.impact_speed;
                (0.01..0.2).contains(&share)
            }) else {
                continue;
            };
            let with = |off: f64| {
                let mut answer = faulty::answer(exact.outcome, exact.end);
                answer.events = exact.events.to_vec();
                answer.events[index].state.velocity += off * problem.impact_speed;
                judge(&question, RTOL, &answer)
            };
            let right = with(0.0);
            assert_eq!(right.verdict, Verdict::Passed, "{}: {}", question.id, right.reason);
            let limit = right.limits.iter().copied().fold(0.0, f64::max);
            let [_, _, conditioning] = conditioning(exact.events[index].state, problem);
            if conditioning > 2.0 {
                slow += 1;
                assert_eq!(with(8.0 * limit * conditioning).verdict, Verdict::Passed, "{}", question.id);
            }
            let wrong = with(20.0 * limit * conditioning);
            assert!(wrong.verdict == Verdict::Failed && wrong.is_in_events, "{}: {}", question.id, wrong.reason);
        }
        assert!(slow > 5, "{slow} events are passed slowly");
    }
}
