//! How each kind of claim is measured. A check is one struct: the fields that the suite file gives, the unit of the
//! measured value, the section of the report, the function that measures, and what the two computations that it compares
//! come from.
//!
//! To add one, declare it with `check!` in the file it belongs to, above its function, and name it in `every_check!` here.

/// Declares checks: `Name { fields } in Section, "unit", by function, compares (Sources | Sources);`.
///
/// The sources are those of [`crate::suite::roads::Source`] that each of the two computations comes from, besides the scene. A
/// check that compares no two computations `compares nothing`.
///
/// The function is called with the subject, after the check itself where that has fields. One that is declared with
/// `counting` in place of `by` counts violations.
macro_rules! check {
    ($($(#[$about:meta])* $name:ident { $($(#[$of:meta])* $field:ident: $type:ty),* $(,)? }
        in $section:ident, $unit:literal, $how:ident $measure:ident, compares $roads:tt;)*) => {$(
        $(#[$about])*
        #[doc = concat!("\n\nUnit: ", $unit, ".")]
        #[derive(Clone, Debug, PartialEq, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$of])* pub $field: $type,)*
        }

        impl $name {
            pub(in crate::suite) const SECTION: $crate::suite::Section = $crate::suite::Section::$section;
            pub(in crate::suite) const UNIT: &str = $unit;
            pub(in crate::suite) const ROADS: Option<[&[$crate::suite::roads::Source]; 2]> = check!(@roads $roads);

            pub(in crate::suite) fn measure(
                &self,
                subject: &$crate::suite::checks::Subject<'_>,
            ) -> $crate::suite::claim::Found {
                check!(@$how self, subject, $measure, $($field)*)
            }
        }
    )*};
    (@roads nothing) => { None };
    (@roads ($($one:ident)* | $($other:ident)*)) => {
        Some([&[$($crate::suite::roads::Source::$one),*], &[$($crate::suite::roads::Source::$other),*]])
    };
    (@by $self:ident, $subject:ident, $measure:ident,) => { $measure($subject) };
    (@by $self:ident, $subject:ident, $measure:ident, $($field:ident)+) => { $measure($self, $subject) };
    (@counting $self:ident, $subject:ident, $measure:ident,) => { $crate::suite::checks::edges::counted(|seen| $measure($subject, seen)) };
    (@counting $self:ident, $subject:ident, $measure:ident, $($field:ident)+) => {
        $crate::suite::checks::edges::counted(|seen| $measure($self, $subject, seen))
    };
}

/// Skips the claim with a reason where it does not apply.
macro_rules! applies {
    ($condition:expr, $($reason:tt)+) => {
        let applies: bool = $condition;
        if !applies {
            return Err(NotMeasured::skip(format!($($reason)+)));
        }
    };
}

/// Fails the claim where its measurement is none.
macro_rules! holds {
    ($condition:expr, $($reason:tt)+) => {
        let holds: bool = $condition;
        if !holds {
            return Err(NotMeasured::broken(format!($($reason)+)));
        }
    };
}

mod agreement;
mod applications;
mod by_hand;
mod commands;
mod conclusions;
mod counts;
mod definitions;
mod edges;
mod expressions;
mod formulas;
mod generators;
mod invariants;
mod known_bad;
mod lanes;
mod manufactured;
mod orders;
mod own_laws;
mod peers;
mod problems;
mod proved;
mod scheme;
mod texts;

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use schemars::JsonSchema;
use serde::de::{Error as _, Unexpected};
use serde::{Deserialize, Deserializer};

use super::claim::{Claim, Found, Judged, Measurement, NotMeasured, Section};
use super::program::Program;
use super::recorded::shipped;
use super::roads::Source;
use super::suite::Scenes;
use crate::exchange::scene_file;
use crate::integrators::method::{Method, MethodName, MethodOptions};
use crate::integrators::{Boundaries, Detail, Flight, VelocityAt};
use crate::physics::reference::Conditions;
use crate::physics::{Advice, Problem, Scene};
use crate::studies::convergence::QuantityStudy;
use crate::studies::error::Truth;
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;

pub use self::{
    agreement::*, applications::*, by_hand::*, commands::*, conclusions::*, counts::*, definitions::*, edges::*,
    expressions::*, formulas::*, generators::*, invariants::*, known_bad::*, lanes::*, manufactured::*, orders::*,
    own_laws::*, peers::*, problems::*, proved::*, scheme::*, texts::*,
};

macro_rules! every_check {
    ($($name:ident)*) => {
        /// How a claim is checked: a struct of this module under its name in kebab case.
        #[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        pub enum Check {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        impl Check {
            /// Unit of the measured value and of the limit.
            pub fn unit(&self) -> &'static str {
                match self { $(Self::$name(_) => $name::UNIT,)* }
            }

            /// Section of the report that shows such claims.
            pub fn section(&self) -> Section {
                match self { $(Self::$name(_) => $name::SECTION,)* }
            }

            /// What the two computations that it compares come from.
            pub(in crate::suite) fn roads(&self) -> Option<[&'static [Source]; 2]> {
                match self { $(Self::$name(_) => $name::ROADS,)* }
            }

            /// Whether it is about the other claims, and measured after them.
            pub fn is_last(&self) -> bool {
                matches!(self, Self::Counted(_) | Self::Remeasured(_) | Self::Independent(_))
            }

            /// Measures a claim.
            ///
            /// # Errors
            /// [`NotMeasured`]: the claim does not apply to its scene, or the measurement itself failed.
            pub fn measure(&self, subject: &Subject<'_>) -> Found {
                match self { $(Self::$name(check) => check.measure(subject),)* }
            }
        }
    };
}

every_check! {
    Gradients UnlikeUnits TablesInMemory Quartiles LimitsOfLadders Boxes MiddleAndBar
    ExactText SetText RefuseText Units Wire WireAnswer
    Exits Recorded ChangedRecord Printed PrintedText PathRows PathMomentum Tolerance StepOption Slopes SpreadParts SpreadSamples
    BatchRows BatchOfScene SweepRows MapLines SetsOfTests StepErrors BenchFigures BenchLevels ThreeGridRule Report
    KnownBad Counted Remeasured Independent
    Reference Agreement Stated Margin Outcome Pair EventOrder
    Nose SmallImpact ApproachOrder ApproachConstant Eq15 Eq15Jump NdrcCriterion
    Order Proportionality WorkOrder SelfConvergence GridConvergence Manufactured
    DiscreteSolution Clock CraterConstant CraterBand LaggedConstant StabilityLimit StabilityMap RoundingFloor
    EnergyBalance TimeReversal Similarity Split JoinedMasses GeneratedLaws Ranges Neutral NamedFaults NamedSchemes ToldSolvers
    Sweep BoundOfData GapFalls ThicknessLimit Intervals HiddenIntervals Map MeasuredDepth Sensitivities Peer
    GrazingLadder Scan BothCrossings ExactlyCritical TripleCoincidence ThinTargets StageEnds ScaledForces Plateau AtAStepEnd SmallTimesAndFarStarts VanishingSpeed LawsOutsideTheirRange
    ForceJump BackAgain AcrossTheCraterEnd ApproachedForEver MarginOfAStop
    Growth StatedStepLimits ClosedFormEverywhere ToleranceSweep SlabRounding LadderRatios OrdersByRule VanishingDrag
    OrderCrossover RandomScenes DigitsLost ViscousResisting ViscousDriven
    Objectives NoRoot CriticalErrorBound JumpsOfEq15
    TableOfScenes BoundsOfLanes
    EveryNumber MarginBound CriticalBound Response StepsByHand Generators Encloses EnclosesTexts SecondOpinion Refuted RefutedLaws
}

/// Reads how many cases there are: without any, nothing would be measured.
fn count<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    let count = usize::deserialize(from)?;
    if count > 0 { Ok(count) } else { Err(D::Error::invalid_value(Unexpected::Unsigned(0), &"one or more")) }
}

/// Reads one or more.
fn some<'de, T: Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<Vec<T>, D::Error> {
    let all = Vec::deserialize(from)?;
    if all.is_empty() { Err(D::Error::invalid_length(0, &"one or more")) } else { Ok(all) }
}

/// Reads a finite number above zero: in units of any other one everything would be small.
fn positive<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    number(from, |number| number > 0.0, "a finite number above zero")
}

/// Reads a number above zero and below one.
fn share<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    number(from, |number| number > 0.0 && number < 1.0, "a number above zero and below one")
}

/// Reads a finite number, zero or above.
fn not_negative<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    number(from, |number| number >= 0.0, "a finite number, zero or above")
}

fn number<'de, D: Deserializer<'de>>(
    from: D,
    is_allowed: fn(f64) -> bool,
    allowed: &'static str,
) -> Result<f64, D::Error> {
    let number = f64::deserialize(from)?;
    if number.is_finite() && is_allowed(number) {
        return Ok(number);
    }
    Err(D::Error::invalid_value(Unexpected::Float(number), &allowed))
}

/// What several claims share, computed once.
#[derive(Debug, Default)]
pub struct Memo {
    /// One run of a scheme gives every quantity.
    studies: Shared<Found<Arc<Vec<QuantityStudy>>>>,
    /// Condition numbers of a scene; `None` where there is no reference.
    conditions: Shared<Option<Conditions>>,
}

/// Values by their keys. Whoever asks while one is computed waits.
#[derive(Debug)]
struct Shared<T>(Mutex<HashMap<String, Arc<OnceLock<T>>>>);

impl<T> Default for Shared<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Clone> Shared<T> {
    /// The value of `key`, by `compute` if nobody has asked for it yet.
    fn get(&self, key: String, compute: impl FnOnce() -> T) -> T {
        let cell = self.0.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default().clone();
        cell.get_or_init(compute).clone()
    }
}

/// What every check may use.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// Scenes by name.
    pub scenes: &'a Scenes,
    /// Answers of other programs.
    pub peers: &'a PeerAnswers,
    /// Studies that claims share.
    pub memo: &'a Memo,
    /// The program, for claims about its commands.
    pub program: Option<&'a Program>,
    /// Measured energies, (H/d, `E_c/(d³ fc)`).
    pub points: &'a [(f64, f64)],
    /// The other claims, judged, for claims about them; `None` while they are, and where a part of the suite is run.
    pub judged: Option<&'a [Judged]>,
    /// Seed of every random number.
    pub seed: u64,
}

/// A claim with what its check may use.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The claim.
    pub claim: &'a Claim,
    /// Scenes, other programs, seed.
    pub context: Context<'a>,
    /// What is wrong on purpose with the solutions of its method.
    pub flaw: Option<Flaw>,
    /// What the check has asked for of what the claim names.
    pub asked: &'a Asked,
}

/// What a claim may name for its check to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Named {
    /// `scenes`.
    Scene,
    /// `methods`.
    Method,
    /// `quantities`.
    Quantity,
    /// `velocities`.
    Velocity,
    /// `boundaries`.
    Boundaries,
}

/// The parts of a claim that its check has asked for: what it does not ask for does not change what it measures.
#[derive(Debug, Default)]
pub struct Asked([AtomicBool; 5]);

impl Asked {
    /// Whether `part` was asked for.
    pub fn has(&self, part: Named) -> bool {
        self.0[part as usize].load(Ordering::Relaxed)
    }
}

impl<'a> Subject<'a> {
    /// What the claim names, noted as asked for.
    fn ask<T>(&self, part: Named, named: Option<T>) -> Option<T> {
        self.asked.0[part as usize].store(true, Ordering::Relaxed);
        named
    }

    /// Name of the scene of the claim, if it has one.
    fn named_scene(&self) -> Option<&'a str> {
        self.ask(Named::Scene, self.claim.scene.as_deref())
    }

    /// Name of the scene of the claim.
    fn scene_name(&self) -> Found<&'a str> {
        self.named_scene().ok_or_else(|| NotMeasured::broken("the claim names no scene"))
    }

    /// The same for a claim about commands, which know the scenes that ship.
    fn shipped_scene(&self) -> Found<&'a str> {
        let name = self.scene_name()?;
        applies!(scene_file::shipped(name).is_some(), "commands are run on scenes that ship");
        Ok(name)
    }

    /// Scene of the claim.
    fn scene(&self) -> Found<&'a Scene> {
        let name = self.scene_name()?;
        self.context.scenes.get(name).ok_or_else(|| NotMeasured::broken(format!("no scene {name}")))
    }

    /// Problem of the claim's scene.
    fn problem(&self) -> Found<&'a Problem> {
        self.context.scenes.problem(self.scene_name()?).map_err(NotMeasured::broken)
    }

    /// Quantity of the claim, if it has one.
    fn named_quantity(&self) -> Option<Quantity> {
        self.ask(Named::Quantity, self.claim.quantity)
    }

    /// Quantity of the claim.
    fn quantity(&self) -> Found<Quantity> {
        self.named_quantity().ok_or_else(|| NotMeasured::broken("the claim names no quantity"))
    }

    /// Velocity rule of the claim.
    fn velocity(&self) -> VelocityAt {
        self.ask(Named::Velocity, self.claim.velocity).unwrap_or_default()
    }

    /// Boundary rule of the claim.
    fn boundaries(&self) -> Boundaries {
        self.ask(Named::Boundaries, self.claim.boundaries).unwrap_or_default()
    }

    /// Name of the claim's method; the Taylor series where it names none.
    fn method_name(&self) -> MethodName {
        self.ask(Named::Method, self.claim.method).unwrap_or_default()
    }

    /// The claim's method at a tolerance, or at its default.
    fn method(&self, rtol: Option<f64>) -> Found<Method> {
        let method = build(self.method_name(), &MethodOptions { rtol, ..MethodOptions::default() })?;
        Ok(match self.flaw {
            Some(flaw) => method.within(|inner| Box::new(Flawed { inner, flaw })),
            None => method,
        })
    }

    /// Solution of the claim's problem by its method at the default tolerance.
    fn solution(&self, detail: Detail) -> Found<Flight> {
        solve(&self.method(None)?, self.problem()?, detail)
    }

    /// The program; without one, a claim about its commands does not apply.
    fn program(&self) -> Found<&'a Program> {
        self.context.program.ok_or_else(|| NotMeasured::lacks("no program whose commands could be run"))
    }

    /// Random numbers of `part`, from the seed of the run.
    fn random(&self, part: &str) -> Random {
        Random::for_part(self.context.seed, part)
    }

    /// The exact solution: as computed elsewhere for a scene that ships, else the closed form; or a refined one.
    fn truth(&self) -> Found<Truth> {
        match shipped(self.scene_name()?) {
            Some(scene) => Ok(Truth { flight: scene.flight().map_err(NotMeasured::broken)?, is_exact: true }),
            None => Ok(Truth::of(self.problem()?)?),
        }
    }
}

/// Makes a claim about the method `name` inapplicable where this build lacks it.
fn must_be_built(name: MethodName) -> Found<()> {
    if name.is_built() { Ok(()) } else { Err(NotMeasured::lacks(format!("this build leaves out {name}"))) }
}

/// The same of every method.
fn complete_build() -> Found<()> {
    MethodName::ALL.iter().copied().try_for_each(must_be_built)
}

/// The method `name`.
fn build(name: MethodName, options: &MethodOptions) -> Found<Method> {
    must_be_built(name)?;
    Ok(Method::new(name, options)?)
}

/// A solution; a refusal of the method makes the claim inapplicable, a failure breaks it.
fn solve(method: &Method, problem: &Problem, detail: Detail) -> Found<Flight> {
    method.integrator().solve(problem, detail).map_err(refusal_or_failure)
}

fn refusal_or_failure(error: impl Advice) -> NotMeasured {
    if error.is_usage() { NotMeasured::skip(error.to_string()) } else { NotMeasured::broken(error) }
}

/// Why a claim about a quantity is skipped.
pub const FIXED: &str = "the scene fixes this quantity";
const LAWS: &str = "a stage has a law of its own, or ends elsewhere than at a place";
const NO_FAR_SIDE: &str = "a target without a far side has no critical velocity";

/// Relative difference of `value` from `exact`.
fn off(value: f64, exact: f64) -> f64 {
    if value == exact { 0.0 } else { (value / exact - 1.0).abs() }
}

/// The larger; NaN if either is.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Largest of `errors`; NaN if one is.
fn worst_of(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, worse)
}

/// The largest of many errors, with the place where it was found. A NaN is larger than any number.
#[derive(Default)]
struct Worst {
    value: f64,
    place: String,
    cases: usize,
}

impl Worst {
    fn take(&mut self, value: f64, place: impl FnOnce() -> String) {
        self.cases += 1;
        if value.is_nan() || value > self.value {
            (self.value, self.place) = (value, place());
        }
    }

    fn measurement(self) -> Measurement {
        let remark = if self.place.is_empty() { String::new() } else { format!("worst {}", self.place) };
        Measurement::new(self.value).remark(remark).cases(self.cases)
    }
}
