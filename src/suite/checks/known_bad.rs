//! The judge judged: claims that are wrong on purpose must come out as such.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Check, Subject};
use crate::integrators::{Detail, Flight, Integrator, Solved};
use crate::physics::{EventKind, Outcome, Problem};
use crate::studies::quantity::Quantity;
use crate::suite::claim::{Claim, Found, Measurement, NotMeasured};
use crate::suite::suite::judge;
use crate::suite::verdict::Verdict;

check! {
    /// A claim that is wrong on purpose, judged as any other: 0 if it comes out as it must, 1 if not. Without its flaw it must pass.
    KnownBad {
        /// The verdict that is right: `failed` or `undecided`.
        is: Bad,
        /// What is wrong with every solution that the check sees; without it, the claim itself is what is wrong.
        flaw: Option<Flaw>,
        /// Limit of the check.
        #[serde(deserialize_with = "crate::suite::checks::not_negative")]
        limit: f64,
        /// The check.
        check: Box<Check>,
    } in Judge, "wrong verdicts", by known_bad, compares nothing;
}

/// How a known-bad claim must come out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Bad {
    /// Failed.
    Failed,
    /// Undecided.
    Undecided,
}

/// What is wrong on purpose with the solutions of a method.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Flaw {
    /// This quantity of the end is not a number.
    NotANumber(Quantity),
    /// Depth of the end times 1 + this.
    Depth(f64),
    /// Time of the end times 1 + this.
    Time(f64),
    /// Velocity of the end, of the events and of the rows of the path but the first times 1 + this.
    Velocity(f64),
    /// This event is not listed.
    Without(FlawedEvent),
    /// This event is listed twice.
    Twice(FlawedEvent),
    /// A stop is called a perforation, and the reverse.
    OtherOutcome(bool),
    /// The exit margin plus this many of its error bounds.
    MarginOff(f64),
    /// The error bound of the exit margin times this.
    MarginBound(f64),
}

/// An event that a flaw names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FlawedEvent {
    /// x = k d.
    CraterEnd,
    /// Rest.
    Rest,
    /// x = exit depth.
    Exit,
}

impl FlawedEvent {
    fn kind(self) -> EventKind {
        match self {
            Self::CraterEnd => EventKind::CraterEnd,
            Self::Rest => EventKind::Rest,
            Self::Exit => EventKind::Exit,
        }
    }
}

impl Flaw {
    fn spoil(self, mut flight: Flight) -> Flight {
        let end = &mut flight.end;
        match self {
            Self::NotANumber(Quantity::Depth) => end.depth = f64::NAN,
            Self::NotANumber(Quantity::Time) => end.time = f64::NAN,
            Self::NotANumber(Quantity::Velocity) => end.velocity = f64::NAN,
            Self::NotANumber(_) => flight.events.iter_mut().for_each(|event| event.state.time = f64::NAN),
            Self::Depth(part) => end.depth *= 1.0 + part,
            Self::Time(part) => end.time *= 1.0 + part,
            Self::Velocity(part) => {
                end.velocity *= 1.0 + part;
                flight.events.iter_mut().for_each(|event| event.state.velocity *= 1.0 + part);
                flight.trajectory.iter_mut().skip(1).for_each(|row| row.state.velocity *= 1.0 + part);
            }
            Self::Without(event) => flight.events.retain(|e| e.kind != event.kind()),
            Self::Twice(event) => {
                if let Some(index) = flight.events.iter().position(|e| e.kind == event.kind()) {
                    flight.events.insert(index, flight.events[index]);
                }
            }
            Self::OtherOutcome(false) => {}
            Self::OtherOutcome(true) => {
                flight.outcome = if flight.outcome.is_stop() { Outcome::Perforated } else { Outcome::Stopped };
            }
            Self::MarginOff(bounds) => {
                let error = flight.exit_margin_error.unwrap_or_default();
                flight.exit_margin = flight.exit_margin.map(|margin| margin + bounds * error);
            }
            Self::MarginBound(factor) => {
                flight.exit_margin_error = flight.exit_margin_error.map(|error| error * factor);
            }
        }
        flight
    }
}

/// A method with a flaw.
pub(super) struct Flawed {
    /// The method.
    pub(super) inner: Box<dyn Integrator + Send + Sync>,
    /// What is wrong with its solutions.
    pub(super) flaw: Flaw,
}

impl Integrator for Flawed {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn order(&self) -> Option<u32> {
        self.inner.order()
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        Ok(self.flaw.spoil(self.inner.solve(problem, detail)?))
    }
}

fn known_bad(KnownBad { is, flaw, limit, check }: &KnownBad, subject: &Subject<'_>) -> Found {
    let claim = Claim { check: (**check).clone(), limit: *limit, unit: check.unit(), ..subject.claim.clone() };
    let judged = judge(Subject { claim: &claim, flaw: *flaw, ..*subject });
    if flaw.is_some() && !judged.lacks {
        let sound = judge(Subject { claim: &claim, flaw: None, ..*subject });
        let is_sound = sound.verdict == Verdict::Passed;
        holds!(is_sound, "without the flaw it is {}, too: {}", sound.verdict.name(), sound.remark);
    }
    if judged.lacks {
        return Err(NotMeasured::lacks(judged.remark));
    }
    let must = match is {
        Bad::Failed => Verdict::Failed,
        Bad::Undecided => Verdict::Undecided,
    };
    let measured = judged.measured.map_or("nothing measured".to_owned(), |measured| format!("{measured:.2e}"));
    let remark = format!(
        "{}: {measured}, limit {limit:.1e} {}; {}",
        judged.verdict.name(),
        claim.unit_in_words(),
        judged.remark
    );
    Ok(Measurement::count(usize::from(judged.verdict != must)).remark(remark))
}
