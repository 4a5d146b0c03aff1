//! What do the two computations that a claim compares have in common? Nothing but the scene, or the claim shows little:
//! a fault in what both use moves both.

use super::checks::Check;
use super::claim::Claim;
use super::recorded::shipped;
use crate::integrators::method::{Accuracy, MethodName};

/// What a number comes from, besides the scene and its problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::Display)]
#[strum(serialize_all = "lowercase")]
pub enum Source {
    /// Another program, a recipe, a publication: a number in a file.
    Elsewhere,
    /// `physics/reference.rs`.
    #[strum(serialize = "50 digits")]
    FiftyDigits,
    /// A formula written in the check itself.
    #[strum(serialize = "the check itself")]
    Check,
    /// Eq. 11-15 and what follows from them.
    #[strum(serialize = "Eq. 11-15")]
    Formulas,
    /// The closed forms of single stages.
    #[strum(serialize = "closed form")]
    ClosedForm,
    /// The loop over stages and the exit margin, common to every method but the central difference.
    #[strum(serialize = "loop over stages")]
    Loop,
    /// Taylor's series.
    Taylor,
    /// The energy formulation.
    Energy,
    /// Series with proved errors. They run in the loop over stages, each number a ball.
    Enclosure,
    /// diffsol.
    Library,
    /// The central difference.
    #[strum(serialize = "central difference")]
    Steps,
    /// Several scenes at once.
    Lanes,
    /// Dual numbers.
    #[strum(serialize = "dual numbers")]
    Duals,
    /// The search for the critical velocity.
    Search,
    /// The commands.
    Commands,
}

use Source::{
    Check as Itself, ClosedForm, Commands, Duals, Elsewhere, Enclosure, Energy, FiftyDigits, Formulas, Lanes, Library,
    Loop, Search, Steps, Taylor,
};

impl Source {
    /// What the answers of `method` come from.
    fn of(method: MethodName) -> Vec<Self> {
        match method {
            MethodName::Taylor => vec![Taylor, Loop],
            MethodName::Energy => vec![Energy, Loop],
            MethodName::ClosedForm => vec![ClosedForm, Loop],
            MethodName::Enclosure => vec![Enclosure, Loop],
            method if method.accuracy() == Accuracy::Step => vec![Steps],
            _ => vec![Library, Loop],
        }
    }
}

/// What the two computations that `claim` compares come from; `None` where it compares none: it counts events, or asks
/// whether one method obeys a law.
#[expect(clippy::too_many_lines, reason = "one table, with a line for each check")]
pub fn roads(claim: &Claim) -> Option<[Vec<Source>; 2]> {
    let method = Source::of(claim.method.unwrap_or_default());
    // The truth of a shipped scene is recorded, that of a user's is the closed form.
    let truth = match &claim.scene {
        Some(scene) if shipped(scene).is_none() => vec![ClosedForm, Loop],
        _ => vec![Elsewhere],
    };
    let with = |mut of: Vec<Source>, also| {
        of.push(also);
        of
    };
    let roads = match &claim.check {
        Check::KnownBad(_)
        | Check::Counted(_)
        | Check::Generators(_)
        | Check::Independent(_)
        | Check::EventOrder(_)
        | Check::TimeReversal(_)
        | Check::Similarity(_)
        | Check::Split(_)
        | Check::Ranges(_)
        | Check::Neutral(_)
        | Check::ScaledForces(_)
        | Check::BoundsOfLanes(_)
        | Check::DigitsLost(_)
        | Check::SlabRounding(_)
        | Check::RoundingFloor(_)
        | Check::LadderRatios(_)
        | Check::ViscousDriven(_)
        | Check::VanishingDrag(_)
        | Check::NoRoot(_)
        | Check::SetText(_)
        | Check::Wire(_)
        | Check::WireAnswer(_)
        | Check::RefuseText(_)
        | Check::PrintedText(_)
        | Check::Report(_)
        // Earlier answers of the same program, or two of its commands: they show that nothing changed, and that all say the same.
        | Check::Recorded(_)
        | Check::BatchRows(_)
        | Check::SweepRows(_) => return None,
        Check::Units(_) => [Vec::new(), vec![Elsewhere]],
        Check::Exits(_) | Check::Printed(_) | Check::Tolerance(_) => {
            [vec![Commands], vec![Elsewhere]]
        }
        Check::PathRows(_)
        | Check::PathMomentum(_)
        | Check::StepOption(_)
        | Check::SpreadParts(_)
        | Check::SpreadSamples(_)
        | Check::MapLines(_)
        | Check::SetsOfTests(_)
        | Check::StepErrors(_)
        | Check::ThreeGridRule(_) => [vec![Commands], vec![Itself]],
        Check::Slopes(_) => [vec![Duals], vec![Itself]],
        Check::Reference(_) | Check::ClosedFormEverywhere(_) => [vec![ClosedForm, Loop], vec![FiftyDigits]],
        Check::Agreement(_) | Check::Proportionality(_) | Check::WorkOrder(_) => [method, truth],
        Check::ExactText(_) | Check::Stated(_) | Check::Outcome(_) | Check::Peer(_) | Check::MeasuredDepth(_) => {
            [method, vec![Elsewhere]]
        }
        Check::Margin(_)
        | Check::GrazingLadder(_)
        | Check::Scan(_)
        | Check::BothCrossings(_)
        | Check::ExactlyCritical(_)
        | Check::TripleCoincidence(_)
        | Check::ThinTargets(_)
        | Check::StageEnds(_)
        | Check::AtAStepEnd(_)
        | Check::SmallTimesAndFarStarts(_)
        | Check::VanishingSpeed(_)
        | Check::ForceJump(_)
        | Check::BackAgain(_)
        | Check::AcrossTheCraterEnd(_)
        | Check::ToleranceSweep(_)
        | Check::ViscousResisting(_)
        // Their truth in double-double is confirmed in 50 digits, but for viscosity and drag together.
        | Check::EveryNumber(_)
        | Check::MarginBound(_)
        | Check::MarginOfAStop(_)
        | Check::Response(_) => [method, vec![FiftyDigits]],
        Check::Encloses(_) => [vec![Enclosure, Loop], vec![FiftyDigits]],
        Check::EnclosesTexts(_) => [vec![Enclosure, Loop], vec![Elsewhere]],
        Check::Refuted(_) => [method.into_iter().filter(|of| *of != Loop).collect(), vec![Enclosure]],
        Check::RandomScenes(_) => [vec![ClosedForm, Taylor, Energy, Loop], vec![FiftyDigits]],
        Check::TableOfScenes(_) => [vec![Lanes], vec![FiftyDigits]],
        Check::Pair(pair) => [method, Source::of(pair.with)],
        Check::Nose(_) | Check::Eq15(_) | Check::JumpsOfEq15(_) | Check::LawsOutsideTheirRange(_) => {
            [vec![Formulas], vec![Itself]]
        }
        Check::Eq15Jump(_) => [vec![Formulas], vec![Elsewhere]],
        Check::SmallImpact(_) | Check::ApproachOrder(_) | Check::ApproachConstant(_) | Check::Map(_) => {
            [method, vec![Formulas]]
        }
        Check::NdrcCriterion(_) => [with(method, Search), vec![Formulas]],
        Check::Sweep(_) => [with(method, Search), vec![ClosedForm]],
        Check::BoundOfData(_) | Check::GapFalls(_) => [with(with(method, Search), Formulas), vec![Elsewhere]],
        Check::Intervals(_) => [with(method, Search), vec![Itself]],
        Check::ThicknessLimit(_) => [method, vec![ClosedForm, Formulas]],
        Check::Order(_) | Check::SelfConvergence(_) | Check::GridConvergence(_) => [vec![Steps], truth],
        Check::OrdersByRule(_) | Check::OrderCrossover(_) => [vec![Steps], vec![FiftyDigits]],
        Check::Manufactured(_)
        | Check::DiscreteSolution(_)
        | Check::Clock(_)
        | Check::CraterConstant(_)
        | Check::CraterBand(_)
        | Check::LaggedConstant(_)
        | Check::StabilityLimit(_)
        | Check::StabilityMap(_)
        | Check::Growth(_)
        | Check::StepsByHand(_)
        | Check::StatedStepLimits(_) => [vec![Steps], vec![Itself]],
        Check::EnergyBalance(_) | Check::JoinedMasses(_) | Check::Plateau(_) | Check::ApproachedForEver(_) => [method, vec![Itself]],
        Check::Sensitivities(_) => [with(method, Duals), vec![Duals, ClosedForm]],
        Check::Objectives(_) => [vec![Energy, Search], vec![ClosedForm]],
        Check::CriticalErrorBound(_) | Check::CriticalBound(_) => [with(method, Search), vec![FiftyDigits]],
    };
    Some(roads)
}

/// A source that both computations come from.
pub fn shared([one, other]: &[Vec<Source>; 2]) -> Option<Source> {
    one.iter().copied().find(|source| other.contains(source))
}
