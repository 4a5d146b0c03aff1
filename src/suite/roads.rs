//! What do the two computations that a claim compares have in common? Nothing but the scene, or the claim shows little:
//! a fault in what both use moves both.

use super::checks::Check;
use super::claim::Claim;
use super::recorded::shipped;
use crate::exchange::scene_file::SHIPPED;
use crate::integrators::method::{Accuracy, MethodName};
use crate::physics::Scene;

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
    Itself,
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
    /// The series of a law of one's own, and its bounds, which the two before have in common.
    #[strum(serialize = "series of a law")]
    LawSeries,
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
    /// Stands for what the answers of the claim's method come from.
    Method,
    /// As `Method`, without the loop over stages.
    MethodItself,
    /// Stands for what the answers of the method come from that the claim compares with.
    OtherMethod,
    /// Stands for the truth of the claim's scene: recorded for one that ships, the closed form for a user's.
    Truth,
}

impl Check {
    /// Whether it is about `method` alone, and need not ask for it.
    pub(super) fn is_about(&self, method: MethodName) -> bool {
        let source = match method {
            MethodName::CentralDifference => Source::Steps,
            MethodName::Enclosure => Source::Enclosure,
            _ => return false,
        };
        self.roads().is_some_and(|roads| roads.concat().contains(&source))
    }
}

impl Source {
    /// What `self` stands for in `claim`.
    fn of(self, claim: &Claim) -> Vec<Self> {
        let method = claim.method.unwrap_or_default();
        match self {
            Self::Method => Self::of_method(method, claim),
            Self::MethodItself => Self::of_method(method, claim).into_iter().filter(|of| *of != Self::Loop).collect(),
            Self::OtherMethod => match &claim.check {
                Check::Pair(pair) => Self::of_method(pair.with, claim),
                _ => Vec::new(),
            },
            Self::Truth => match &claim.scene {
                Some(scene) if shipped(scene).is_none() => vec![Self::ClosedForm, Self::Loop],
                _ => vec![Self::Elsewhere],
            },
            itself => vec![itself],
        }
    }

    /// What the answers of `method` come from on the scene of `claim`.
    fn of_method(method: MethodName, claim: &Claim) -> Vec<Self> {
        match method {
            MethodName::Taylor | MethodName::Energy if claim.scene.as_deref().is_some_and(has_laws) => {
                vec![Self::LawSeries, Self::Loop]
            }
            MethodName::Taylor => vec![Self::Taylor, Self::Loop],
            MethodName::Energy => vec![Self::Energy, Self::Loop],
            MethodName::ClosedForm => vec![Self::ClosedForm, Self::Loop],
            MethodName::Enclosure => vec![Self::Enclosure, Self::Loop],
            method if method.accuracy() == Accuracy::Step => vec![Self::Steps],
            _ => vec![Self::Library, Self::Loop],
        }
    }
}

/// Whether the problem of the shipped scene `name` has a law of its own.
fn has_laws(name: &str) -> bool {
    let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text);
    let problem = text.and_then(|text| Scene::from_toml(text, name).ok()?.problem().ok());
    problem.is_some_and(|problem| !problem.laws.is_empty())
}

/// What the two computations that `claim` compares come from, as its check declares; `None` where it compares none: it
/// counts events, or asks whether one method obeys a law.
pub fn roads(claim: &Claim) -> Option<[Vec<Source>; 2]> {
    let roads = claim.check.roads()?;
    Some(roads.map(|road| road.iter().flat_map(|source| source.of(claim)).collect()))
}

/// A source that both computations come from.
pub fn shared([one, other]: &[Vec<Source>; 2]) -> Option<Source> {
    one.iter().copied().find(|source| other.contains(source))
}
