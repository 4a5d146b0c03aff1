//! The report of `diagnose`: whether a solver is right, what is wrong with it, and what it was asked.

use std::fmt::Display;

use super::Environment;
use super::chart::{Anchor, Axis, Ink, Panel, Style};
use super::figure::Figure;
use super::junit::Case;
use super::study::{Cell, Element, Headline, PROVED, Prose, Section, Sheet, StudyReport, interval_text, order_text};
use super::text::{count, number};
use crate::studies::Verdict;
use crate::studies::diagnosis::{ALLOWED, Asked, Content, Diagnosis, Each, QUANTITIES, TOLERANCES};
use crate::studies::error::compare;

/// Failing questions shown one by one at most.
const FAILING_MAX: usize = 20;

/// Questions listed on the page at most.
const LISTED_MAX: usize = 1000;

/// Height of a row of the figure of contents (px).
const ROW: f64 = 27.0;

/// Depth, time and velocity in the order of [`QUANTITIES`].
fn each(of: &Each) -> [f64; 3] {
    [of.depth, of.time, of.velocity]
}

/// Size of the error of a quantity, where there is an answer; what has no limit for small steps has none.
fn error(asked: &Asked, quantity: usize) -> Option<f64> {
    let error = each(asked.relative_error.as_ref()?)[quantity].abs();
    (asked.dt_s.is_none() || error.is_finite()).then_some(error)
}

/// The same over what is allowed; fixed steps have no such limit.
fn share(asked: &Asked, quantity: usize) -> Option<f64> {
    let (error, limit) = (error(asked, quantity)?, each(asked.limit.as_ref()?)[quantity]);
    // No error is no share, also of a limit of zero.
    Some(if error == 0.0 { 0.0 } else { error / limit })
}

/// The largest of a question.
fn worst_share(asked: &Asked) -> Option<f64> {
    (0..3).filter_map(|quantity| share(asked, quantity)).max_by(|a, b| compare(*a, *b))
}

/// Questions that were asked.
fn asked(found: &Diagnosis) -> impl Iterator<Item = &Asked> + Clone {
    found.questions.iter().filter(|asked| asked.verdict != Verdict::Skipped)
}

/// The largest error of a quantity, and its question.
fn largest(found: &Diagnosis, quantity: usize) -> Option<(f64, &Asked)> {
    let all = asked(found).filter_map(|asked| Some((error(asked, quantity)?, asked)));
    all.max_by(|a, b| compare(a.0, b.0))
}

/// The largest error of a quantity over its limit, which may be of another question than the largest error.
fn largest_share(found: &Diagnosis, quantity: usize) -> Option<f64> {
    asked(found).filter_map(|asked| share(asked, quantity)).max_by(|a, b| compare(*a, *b))
}

/// The setting at which an answer was given.
fn setting(asked: &Asked) -> String {
    match (asked.rtol, asked.dt_s) {
        (Some(rtol), _) => format!(" at rtol {}", number(rtol, 2)),
        (None, Some(_)) => " in the limit of small steps".to_owned(),
        _ => String::new(),
    }
}

/// Words for a quantity and what its error is relative to.
fn relative_to(quantity: usize) -> &'static str {
    ["the right depth", "the right time", "the impact velocity"].get(quantity).copied().unwrap_or_default()
}

/// The report of what was `found` with this seed.
pub fn report(found: &Diagnosis, seed: u64, environment: Environment) -> StudyReport {
    let peer = &found.peer;
    let words = [peer.name.as_str(), peer.version.as_str()];
    let title = words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ");
    let takes = if peer.fixed_step {
        "on a ladder of steps".to_owned()
    } else {
        format!("each at relative tolerances of {}", TOLERANCES.map(|rtol| number(rtol, 1)).join(", "))
    };
    let subject = Prose::new(
        "Diagnosis of the solver `{0}`{1}: {2} whose right answers are known, {3}.",
        &[
            &peer.command,
            &if peer.method.is_empty() { String::new() } else { format!(" (method {})", peer.method) },
            &count(found.counts.asked, "question"),
            &takes,
        ],
    );
    let mut sections = vec![
        Section { id: "result", title: "Result", parts: result(found) },
        Section { id: "judged", title: "Who was asked, and how", parts: judged(found, seed) },
        Section { id: "orders", title: "Scheme and orders", parts: orders(found) },
        Section { id: "coverage", title: "What was asked, and what passed", parts: coverage(found) },
        Section { id: "failing", title: "Answers that fail", parts: failing(found) },
        Section { id: "uncertainty", title: "Numerical uncertainty", parts: uncertainty(found) },
        Section { id: "questions", title: "Every question", parts: every_question(found) },
    ];
    sections.retain(|section| !section.parts.is_empty());
    StudyReport {
        title,
        subject,
        verdict: found.verdict,
        meaning: meaning(found),
        headline: headline(found),
        sections,
        cases: found.questions.iter().map(case).collect(),
        environment,
        inputs: vec![("Seed", seed.to_string()), ("Solver", peer.command.clone())],
    }
}

fn meaning(found: &Diagnosis) -> Prose {
    let counts = found.counts;
    let cause = found.causes.first().map(|cause| {
        let explains = match (cause.explains, cause.of) {
            (explains, of) if explains > 0 && found.verdict == Verdict::Failed => {
                format!(", and explains {explains} of {of} failing answers")
            }
            _ => String::new(),
        };
        format!(" Cause: {} ({}{explains}).", cause.statement, cause.certainty)
    });
    let cause = cause.unwrap_or_default();
    match found.verdict {
        Verdict::Passed => {
            let limits = if cause.is_empty() {
                String::new()
            } else {
                let what = if found.orders.is_empty() { "What limits its accuracy" } else { "What lowers its order" };
                cause.replacen("Cause", what, 1)
            };
            Prose::new("Sound: every answer is right within what the solver claims.{0}", &[&limits])
        }
        Verdict::Failed if counts.failed == 0 => {
            Prose::new("Wrong, though every answer is near the right one.{0}", &[&cause])
        }
        Verdict::Failed => {
            let gaps: [&dyn Display; 3] = [&counts.failed, &count(counts.asked, "answer"), &cause];
            Prose::new("Wrong: {0} of {1} fail.{2}", &gaps)
        }
        Verdict::Undecided | Verdict::Skipped => {
            let gaps: [&dyn Display; 3] = [&counts.undecided, &count(counts.asked, "answer"), &cause];
            Prose::new("{0} of {1} cannot be judged.{2}", &gaps)
        }
    }
}

fn headline(found: &Diagnosis) -> Vec<Headline> {
    let counts = found.counts;
    let worst = (0..3).filter_map(|quantity| Some((quantity, largest(found, quantity)?)));
    let worst = worst.max_by(|a, b| compare(a.1.0, b.1.0));
    let error = match worst {
        Some((quantity, (error, asked))) => Headline {
            label: "Largest error",
            value: number(error, 2),
            note: Prose::new(
                "of the {0}, relative to {1}: question {2}{3}",
                &[&QUANTITIES[quantity], &relative_to(quantity), &asked.id, &setting(asked)],
            ),
        },
        None => Headline { label: "Largest error", value: "not known".to_owned(), note: "no answer has one".into() },
    };
    let share = asked(found).filter_map(|asked| Some((worst_share(asked)?, asked))).max_by(|a, b| compare(a.0, b.0));
    let share = if let Some((share, asked)) = share {
        Headline {
            label: "Largest error over its limit",
            value: number(share, 2),
            note: Prose::new("times the limit, of question {0}", &[&asked.id]),
        }
    } else {
        let note = if found.peer.fixed_step { "fixed steps are judged by their limit" } else { "no answer has one" };
        Headline { label: "Largest error over its limit", value: "none".to_owned(), note: note.into() }
    };
    let orders = found.orders.iter().filter_map(|order| Some((order, order.observed_order?)));
    let third = match orders.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((order, observed)) => {
            let interval = order
                .interval
                .map_or(String::new(), |interval| format!(", 95\u{a0}% interval {}", interval_text(interval)));
            let claimed =
                order.formal_order.map_or(String::new(), |formal| format!("; {} is claimed", order_text(formal)));
            Headline {
                label: "Observed order",
                value: order_text(observed),
                note: Prose::new("lowest, of the {0}{1}{2}", &[&order.quantity, &interval, &claimed]),
            }
        }
        None => match found.causes.first() {
            Some(cause) => Headline {
                label: "Cause",
                value: cause.factor.map_or_else(|| "named".to_owned(), |factor| format!("× {}", number(factor, 4))),
                note: Prose::new("{0}, {1}", &[&cause.id, &cause.certainty]),
            },
            None => Headline {
                label: "Causes",
                value: "none".to_owned(),
                note: if found.verdict == Verdict::Passed {
                    "nothing to explain".into()
                } else {
                    "no known cause explains it".into()
                },
            },
        },
    };
    let skipped = match counts.skipped {
        0 => Prose::default(),
        skipped => Prose::new("{0} further questions were not needed", &[&skipped]),
    };
    let right =
        Headline { label: "Answers right", value: format!("{} of {}", counts.passed, counts.asked), note: skipped };
    vec![error, share, third, right]
}

fn result(found: &Diagnosis) -> Vec<Element> {
    let mut parts = Vec::new();
    if !found.causes.is_empty() {
        let header =
            ["cause", "certainty", "factor", "what is wrong", "explains", "largest difference left"].map(Prose::from);
        let caption =
            if found.verdict == Verdict::Passed { "What lowers the order" } else { "What is wrong, likeliest first" };
        let sheet = Sheet::cards("causes", caption.into(), header).rows(&found.causes, |cause| {
            [
                Cell::code(&cause.id),
                Cell::text(cause.certainty),
                Cell::Number(cause.factor, 6),
                Cell::text(&cause.statement),
                Cell::Of(cause.explains, cause.of),
                Cell::Number(cause.largest_difference, 2),
            ]
        });
        parts.push(Element::Table(sheet));
    }
    if let Some(separation) = &found.separation {
        parts.push(Element::Text(Prose::new("{0}.", &[separation])));
    }
    // Fixed steps are judged by their limit for small steps, and have no share of another.
    let has_limits = asked(found).any(|asked| worst_share(asked).is_some());
    let limited = |columns: [Cell; 2]| if has_limits { columns.to_vec() } else { Vec::new() };
    let mut header: Vec<Prose> = ["quantity", "largest error", "relative to", "of question"].map(Prose::from).into();
    if has_limits {
        header.extend(["answers within the limit", "largest error over its limit"].map(Prose::from));
    }
    let papers = 1..header.len();
    let sheet = Sheet::cards("quantities", "Result by quantity, over all questions".into(), header).for_papers(papers);
    parts.push(Element::Table(sheet.rows(0..3, |quantity| {
        let (right, all) = right(asked(found), quantity);
        let worst = largest(found, quantity);
        let mut cells = vec![
            Cell::text(QUANTITIES[quantity]),
            Cell::Number(worst.map(|worst| worst.0), 2),
            Cell::text(relative_to(quantity)),
            Cell::text(worst.map_or("", |worst| worst.1.id.as_str())),
        ];
        cells.extend(limited([Cell::Of(right, all), Cell::Number(largest_share(found, quantity), 2)]));
        cells
    })));
    parts
}

/// How many of these answers are within their limit in a quantity, and how many have it.
fn right<'q>(questions: impl Iterator<Item = &'q Asked>, quantity: usize) -> (usize, usize) {
    let shares = questions.filter_map(|asked| share(asked, quantity));
    shares.fold((0, 0), |(right, all), share| (right + usize::from(share <= 1.0), all + 1))
}

fn judged(found: &Diagnosis, seed: u64) -> Vec<Element> {
    let peer = &found.peer;
    let counts = found.counts;
    let gaps: [&dyn Display; 4] = [&counts.passed, &counts.failed, &counts.undecided, &counts.skipped];
    let facts = vec![
        ("Solver", Prose::text(&peer.name)),
        ("Version", Prose::text(&peer.version)),
        ("Method", Prose::text(&peer.method)),
        ("Command", Prose::code(&peer.command)),
        ("Reads", Prose::text(if peer.reads == "scene" { "physical scenes" } else { "stages" })),
        ("Takes", Prose::text(if peer.fixed_step { "its step" } else { "a relative tolerance" })),
        ("Answers", Prose::new("{0} right, {1} wrong, {2} undecided, {3} not asked", &gaps)),
        ("Seed", Prose::text(seed)),
    ];
    let how = if peer.fixed_step {
        "Each question is asked on a ladder of steps; the limit of the answers is judged against the right answer, and the order \
         against the one that the solver claims."
    } else {
        "Each question is asked at three tolerances. An answer may err by a thousand tolerances times the condition number of its \
         problem; the errors shown are those at the finest."
    };
    vec![
        Element::Facts(facts),
        Element::Text(
            "Code verification compares a solver with problems whose solutions are known [@salari2000, oberkampf2010, asme2019, \
             aiaa1998]. The problems here are generated: stages with a static force, a spring, a viscosity and a drag, and physical \
             scenes of a rigid projectile in concrete [@zaidi2009]; their right answers are closed forms, or series to \
             round-off where there is none."
                .into(),
        ),
        Element::Text(how.into()),
    ]
}

fn orders(found: &Diagnosis) -> Vec<Element> {
    let mut parts = Vec::new();
    if let Some(scheme) = &found.scheme {
        let words: Vec<&str> = [scheme.velocity, Some(scheme.name), scheme.events].into_iter().flatten().collect();
        let gaps: [&dyn Display; 2] = [&words.join(", "), &number(scheme.largest_difference, 1)];
        parts.push(Element::Text(Prose::new("The scheme is {0}: it reproduces every answer to {1}.", &gaps)));
    }
    if !found.orders.is_empty() {
        let header = ["quantity", "claimed", "found", "95 % interval", "errors", "verdict"].map(Prose::from);
        let sheet = Sheet::cards("orders", "Orders over all questions".into(), header).for_papers(1..4);
        parts.push(Element::Table(sheet.rows(&found.orders, |order| {
            [
                Cell::text(order.quantity),
                Cell::Order(order.formal_order),
                Cell::Order(order.observed_order),
                Cell::Interval(order.interval),
                Cell::text(order.class.name()),
                if order.formal_order.is_some() { Cell::Verdict(order.verdict) } else { Cell::Empty },
            ]
        })));
    }
    parts
}

/// Questions whose flight meets all of `contents`.
fn with<'f>(found: &'f Diagnosis, contents: &[Content]) -> impl Iterator<Item = &'f Asked> + Clone {
    asked(found).filter(move |asked| contents.iter().all(|content| asked.contains.contains(content)))
}

/// How many of them passed, and how many there are.
fn passed<'q>(questions: impl Iterator<Item = &'q Asked>) -> (usize, usize) {
    questions.fold((0, 0), |(right, all), asked| (right + usize::from(asked.verdict == Verdict::Passed), all + 1))
}

fn coverage(found: &Diagnosis) -> Vec<Element> {
    let met: Vec<Content> = Content::TERMS
        .into_iter()
        .chain(Content::EVENTS)
        .filter(|content| with(found, &[*content]).next().is_some())
        .collect();
    if met.is_empty() {
        return Vec::new();
    }
    let mut parts: Vec<Element> = figures(found, &met).into_iter().map(Element::Figure).collect();
    let has_limits = asked(found).any(|asked| worst_share(asked).is_some());
    let header =
        ["the flight meets", "answers right", "depth", "time", "velocity", "worst over its limit"].map(Prose::from);
    let columns = if has_limits { header.len() } else { 2 };
    let caption = if has_limits {
        "Terms and events: answers right, and quantities within their limit"
    } else {
        "Terms and events: answers right"
    };
    let sheet = Sheet::grid("contents", caption.into(), header.into_iter().take(columns)).for_papers(1..columns);
    let sheet = sheet.rows(&met, |content| {
        let meeting = [*content];
        let questions = || with(found, &meeting);
        let (right_all, all) = passed(questions());
        let of = |quantity| {
            let (right, all) = right(questions(), quantity);
            Cell::Of(right, all)
        };
        let worst = questions().filter_map(worst_share).max_by(|a, b| compare(*a, *b));
        let cells =
            [Cell::text(content.words()), Cell::Of(right_all, all), of(0), of(1), of(2), Cell::Number(worst, 2)];
        cells.into_iter().take(columns).collect::<Vec<_>>()
    });
    parts.push(Element::Table(sheet));
    let terms: Vec<Content> = Content::TERMS.into_iter().filter(|term| met.contains(term)).collect();
    let events: Vec<Content> = Content::EVENTS.into_iter().filter(|event| met.contains(event)).collect();
    let header = [Prose::default()].into_iter().chain(events.iter().map(|event| Prose::text(event.words())));
    let sheet = Sheet::grid(
        "coverage",
        "Terms against events: answers right of those asked, a dash where none meets both".into(),
        header,
    );
    let sheet = sheet.for_papers(1..=events.len()).rows(terms, |term| {
        let cells = events.iter().map(|event| {
            let (right, all) = passed(with(found, &[term, *event]));
            Cell::Of(right, all)
        });
        [Cell::text(term.words())].into_iter().chain(cells).collect::<Vec<_>>()
    });
    parts.push(Element::Table(sheet));
    parts
}

fn figures(found: &Diagnosis, met: &[Content]) -> Vec<Figure> {
    let figure = |name: &str, message: String, reading: &str, panel: Panel| Figure {
        name: name.to_owned(),
        section: None,
        message,
        reading: reading.to_owned(),
        claims: Vec::new(),
        panels: vec![panel],
    };
    // Those that fail most first, from the top down.
    let mut rows: Vec<(Content, usize, usize)> = met
        .iter()
        .map(|content| {
            let (right, all) = passed(with(found, &[*content]));
            (*content, right, all)
        })
        .collect();
    let fails = |&(_, right, all): &(Content, usize, usize)| (all - right) as f64 / all.max(1) as f64;
    rows.sort_by(|a, b| fails(b).total_cmp(&fails(a)));
    let height = rows.len() as f64;
    let most = rows.iter().map(|(.., all)| *all).max().unwrap_or(1) as f64;
    // The first text stands clear of the axis above it.
    let top = height + 0.15;
    let y = Axis::linear("", "").over([0.0, top]);
    let mut panel = Panel::new("", Axis::linear("questions", "").over([0.0, 1.05 * most]), y).tall(ROW * top);
    let bar = |row: usize, from: usize, to: usize| {
        let (bottom, top) = (height - row as f64 - 0.86, height - row as f64 - 0.54);
        let (from, to) = (from as f64, to as f64);
        [(from, bottom), (to, bottom), (to, top), (from, top)]
    };
    for (row, &(content, right, all)) in rows.iter().enumerate() {
        panel = panel.series("right", Style::area(Ink::Blue), bar(row, 0, right));
        if right < all {
            panel = panel.series("wrong or undecided", Style::area(Ink::Red), bar(row, right, all));
        }
        let text = if right < all {
            format!("{}: {} of {all} not right", content.words(), all - right)
        } else {
            format!("{}: {all} of {all} right", content.words())
        };
        panel = panel.label((0.0, height - row as f64 - 0.24), text, Anchor::Start);
    }
    let mut all = vec![figure(
        "right-by-content",
        "Answers that fail against answers that pass, by what the flight meets".to_owned(),
        "Each bar, below its name, counts the questions whose flight meets the term or event; a question meets several.",
        panel,
    )];
    let of = |verdict: fn(Verdict) -> bool| {
        let questions = asked(found).enumerate().filter(move |(_, asked)| verdict(asked.verdict));
        questions.filter_map(|(index, asked)| Some((index as f64 + 1.0, worst_share(asked)?))).collect::<Vec<_>>()
    };
    let (right, wrong) = (of(|verdict| verdict == Verdict::Passed), of(|verdict| verdict != Verdict::Passed));
    let y = Axis::log("largest error over its limit", "").from(1e-9).including([1.0]);
    let mut panel = Panel::new("", Axis::linear("question, in the order asked", ""), y);
    if !right.is_empty() {
        panel = panel.series("right", Style::marks(0), right);
    }
    if !wrong.is_empty() {
        panel = panel.series("wrong or undecided", Style::marks(1).ink(Ink::Red), wrong);
    }
    if !panel.is_empty() {
        all.push(figure(
            "errors-by-question",
            "The worst error of each answer, over what is allowed".to_owned(),
            "At the dashed line the error is the limit. A wrong answer below it has right numbers and a wrong outcome or \
             event. Errors below a billionth of the limit are drawn there. Answers without numbers have no point.",
            panel.slope("limit", 0.0, (1.0, 1.0)),
        ));
    }
    all
}

/// What a question meets, in words.
fn meets(asked: &Asked) -> String {
    asked.contains.iter().map(|content| content.words()).collect::<Vec<_>>().join(", ")
}

/// A signed relative error of a quantity.
fn off(asked: &Asked, quantity: usize) -> Cell {
    let signed = asked.relative_error.as_ref().map(|error| each(error)[quantity]);
    Cell::Number(signed.filter(|_| error(asked, quantity).is_some()), 3)
}

fn failing(found: &Diagnosis) -> Vec<Element> {
    let mut failing: Vec<&Asked> =
        asked(found).filter(|asked| matches!(asked.verdict, Verdict::Failed | Verdict::Undecided)).collect();
    if failing.is_empty() {
        return Vec::new();
    }
    failing.sort_by_key(|asked| asked.contains.len());
    let more = failing.len().saturating_sub(FAILING_MAX);
    let header =
        ["question", "meets", "says", "right is", "depth off", "time off", "velocity off", "why"].map(Prose::from);
    let caption = "Answers that fail or cannot be judged, those that meet least first; errors relative, signed".into();
    let sheet = Sheet::cards("failing", caption, header).rows(failing.iter().take(FAILING_MAX), |asked| {
        [
            Cell::code(&asked.id),
            Cell::text(meets(asked)),
            Cell::text(asked.answered.map_or("", |end| end.outcome.name())),
            Cell::text(asked.expected.outcome.name()),
            off(asked, 0),
            off(asked, 1),
            off(asked, 2),
            Cell::Prose(Prose::said(&asked.reason)),
        ]
    });
    let mut parts = vec![Element::Table(sheet)];
    if failing.iter().take(FAILING_MAX).any(|asked| asked.reason.contains("proved")) {
        parts.push(Element::Text(PROVED.into()));
    }
    if more > 0 {
        parts.push(Element::Text(Prose::new("{0} more are under Every question.", &[&more])));
    }
    parts
}

/// A paragraph for a paper, of a sound solver alone.
fn uncertainty(found: &Diagnosis) -> Vec<Element> {
    if found.verdict != Verdict::Passed {
        let text = "No numerical uncertainty is stated for a solver that is not shown to be sound.";
        return vec![Element::Text(text.into())];
    }
    let peer = &found.peer;
    let gaps: [&dyn Display; 3] = [&peer.name, &peer.version, &count(found.counts.asked, "generated problem")];
    let mut text =
        Prose::new("The solver {0} {1} was verified on {2} with known solutions [@salari2000, oberkampf2010].", &gaps);
    let finest = TOLERANCES.iter().copied().fold(f64::INFINITY, f64::min);
    text = text.then(if peer.fixed_step {
        " The limits of its answers for small steps agree with them within their scatter, by".into()
    } else {
        let gaps: [&dyn Display; 2] = [&number(ALLOWED, 1), &number(finest, 1)];
        Prose::new(
            " No error exceeded {0} relative tolerances times the condition number of its problem; at a tolerance of {1} the \
             largest were",
            &gaps,
        )
    });
    for (quantity, name) in QUANTITIES.iter().enumerate() {
        let Some((error, _)) = largest(found, quantity) else { continue };
        let gaps: [&dyn Display; 3] = [name, &number(error, 2), &relative_to(quantity)];
        text = text.then(if quantity > 0 { ",".into() } else { Prose::default() });
        let template = if peer.fixed_step { " {1} of {2}" } else { " {u_num}({0}) = {1} of {2}" };
        text = text.then(Prose::new(template, &gaps));
    }
    if peer.fixed_step {
        text = text.then(" at most".into());
    }
    text = text.then(".".into());
    for order in &found.orders {
        if let (Some(observed), Some(interval)) = (order.observed_order, order.interval) {
            let gaps: [&dyn Display; 3] = [&order.quantity, &order_text(observed), &interval_text(interval)];
            text = text.then(Prose::new(" The observed order of the {0} is {1} (95\u{a0}% interval {2}).", &gaps));
        }
    }
    vec![
        Element::Text("To paste into a paper; `uncertainty.tex` has it with its citations:".into()),
        Element::Paste(text),
        Element::Text(
            "That is verification of the code, on these problems. The uncertainty of one solution of your own follows from its own \
             refinement [@asme2009]: `penetrode audit` states it."
                .into(),
        ),
    ]
}

fn every_question(found: &Diagnosis) -> Vec<Element> {
    if found.questions.len() > LISTED_MAX {
        let text = "There are {0}: `report.json` has all of them.";
        return vec![Element::Text(Prose::new(text, &[&count(found.questions.len(), "question")]))];
    }
    let header =
        ["question", "meets", "verdict", "depth off", "time off", "velocity off", "worst over its limit", "why"];
    let caption = "Every question; errors relative, signed".into();
    let sheet = Sheet::cards("questions", caption, header.map(Prose::from)).rows(&found.questions, |asked| {
        [
            Cell::code(&asked.id),
            Cell::text(meets(asked)),
            Cell::Verdict(asked.verdict),
            off(asked, 0),
            off(asked, 1),
            off(asked, 2),
            Cell::Number(worst_share(asked), 2),
            Cell::Prose(Prose::said(&asked.reason)),
        ]
    });
    vec![Element::Folded(sheet)]
}

fn case(asked: &Asked) -> Case {
    let of = |quantity: usize| {
        let share = share(asked, quantity).map_or(String::new(), |share| format!(", {share:e} of its limit"));
        Some(format!("{} off by {:e}{share}", QUANTITIES[quantity], error(asked, quantity)?))
    };
    let numbers = match asked.verdict {
        Verdict::Skipped => "not asked".to_owned(),
        _ if asked.relative_error.is_none() => "no numbers".to_owned(),
        _ => (0..3).filter_map(of).collect::<Vec<_>>().join("; "),
    };
    let text = format!("meets {}\n{numbers}\n{}", meets(asked), asked.reason);
    Case { name: asked.id.clone(), verdict: asked.verdict, numbers, text, wall_ms: 0.0 }
}

#[cfg(test)]
mod tests {
    use strum::IntoEnumIterator;

    use super::*;

    #[test]
    fn every_content_of_a_question_is_a_term_or_an_event() {
        for content in Content::iter() {
            assert_ne!(Content::TERMS.contains(&content), Content::EVENTS.contains(&content), "{content}");
        }
    }
}
