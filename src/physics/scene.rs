//! A scene: projectile, target, resistance and criterion in SI units, and the stages it resolves into.
//!
//! A scene may come from a file ([`crate::exchange::scene_file`]), a table or a sweep. [`Scene::resolve`] therefore checks
//! every number before it returns a [`Problem`].

use std::sync::LazyLock;

use thiserror::Error;

use super::advice::Advice;
use super::condition::Condition;
use super::expression::{Known, Tape};
use super::force_table::{ForceTable, SpeedTable};
use super::law::{Law, Laws, OwnParameter};
use super::parameter::{LayerNumber, Parameter, StageNumber};
use super::plug::{Plug, Slab};
use super::problem::{Problem, Stage, Stages, Target};
use super::scalar::Scalar;
use super::semi_empirical::{self, UseOfEq14};
use super::units::Dimension;
use crate::text::Shown;

/// What the projectile meets.
#[derive(Clone, Debug, PartialEq)]
pub enum Resistance {
    /// Eq. 4-5: a crater `F = c x` to k d, then a tunnel `F = P + Q V²`.
    Concrete(Concrete),
    /// Stages given directly. Of one whose force stands in [`Scene::forces`], only the end counts.
    Stages(Vec<Stage>),
}

/// A force of a stage in place of its four coefficients.
#[derive(Clone, Debug, PartialEq)]
pub enum Force {
    /// A table of depth.
    Table(ForceTable),
    /// A table of velocity.
    SpeedTable(SpeedTable),
    /// An expression of x, V and [`Scene::parameters`].
    Expression(Tape),
}

/// How a stage ends besides at a depth, and what joins the projectile at its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OwnEnd {
    /// The condition that ends it, if there is one.
    pub condition: Option<Ending>,
    /// The mass (kg) that joins there, its momentum zero before.
    pub add_mass: Option<f64>,
}

/// A condition that ends a stage.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// The velocity (m/s) is no longer above this.
    Velocity(f64),
    /// The two sides of an equation of x, V and [`Scene::parameters`] are equal.
    Until(Tape),
}

impl OwnEnd {
    /// Its number `which`.
    pub(super) fn number(&self, which: StageNumber) -> Option<f64> {
        match (which, &self.condition) {
            (StageNumber::EndVelocity, Some(Ending::Velocity(velocity))) => Some(*velocity),
            (StageNumber::AddMass, _) => self.add_mass,
            _ => None,
        }
    }

    pub(super) fn number_mut(&mut self, which: StageNumber) -> Option<&mut f64> {
        match (which, &mut self.condition) {
            (StageNumber::EndVelocity, Some(Ending::Velocity(velocity))) => Some(velocity),
            (StageNumber::AddMass, _) => self.add_mass.as_mut(),
            _ => None,
        }
    }
}

/// A mass as an expression.
fn mass_itself() -> &'static Tape {
    static TAPE: LazyLock<Option<Tape>> = LazyLock::new(|| {
        let unit = Dimension::Mass.into();
        Tape::read("m", &[Known { name: "m", value: 0.0, unit }], unit).ok()
    });
    match &*TAPE {
        Some(tape) => tape,
        None => unreachable!("the text of a mass is an expression"),
    }
}

/// The numbers of Eq. 4-5, 13 and 14.
#[derive(Clone, Debug, PartialEq)]
pub struct Concrete {
    /// Projectile diameter d (m).
    pub diameter: f64,
    /// Nose factor N*, 0 to 1.
    pub nose_factor: f64,
    /// Unconfined compressive strength fc (Pa); with layers that of the layer just beyond k d.
    pub strength: f64,
    /// Density rho (kg/m³); with layers that of the layer just beyond k d.
    pub density: f64,
    /// Static strength over fc, S (Eq. 14 when not given); with layers that of the layer just beyond k d.
    pub static_factor: f64,
    /// True if no S is stated: it follows the strength by Eq. 14.
    pub follows_eq14: bool,
    /// Inertia factor B.
    pub inertia_factor: f64,
    /// Crater depth in diameters, k.
    pub crater_ratio: f64,
    /// How the crater constant c is chosen.
    pub crater_stiffness: CraterStiffness,
    /// Layers in place of one strength and density; empty for a homogeneous target.
    pub layers: Vec<Layer>,
}

/// The crater constant c (docs/theory.md, section 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CraterStiffness {
    /// The force is continuous at x = k d: `c = M (P + Q V0²)/(k d (M + k d Q))`.
    Continuous,
    /// A given value (N/m); the force generally jumps at k d.
    Given(f64),
}

/// One layer of a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Thickness (m); infinite in a semi-infinite last layer.
    pub thickness: f64,
    /// Unconfined compressive strength fc (Pa); 0 is an air gap.
    pub strength: f64,
    /// Density rho (kg/m³).
    pub density: f64,
    /// Static strength over fc, S.
    pub static_factor: f64,
    /// True if no S is stated: it follows the strength by Eq. 14.
    pub follows_eq14: bool,
    /// Linear viscosity r (kg/s).
    pub viscosity: f64,
}

/// When the target counts as perforated.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantNames,
    serde::Serialize,
)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[strum(serialize_all = "kebab-case")]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// x = H, the paper's.
    #[default]
    FullDepth,
    /// x = `x_p(H)`, the penetration that perforates by the ACE/NDRC relation (docs/theory.md, section 4).
    Ndrc,
    /// The rest of the slab breaks off as a plug ([`super::plug`]), or x = H before that.
    Plug,
}

impl Criterion {
    /// Where the projectile is when the target counts as perforated, for people.
    pub fn place(self) -> &'static str {
        match self {
            Self::FullDepth => "x = H",
            Self::Ndrc => "x = x_p(H), the NDRC relation",
            Self::Plug => "the plug",
        }
    }
}

/// A scene in SI units, admissible throughout.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Title for people.
    pub title: Option<String>,
    /// Projectile mass M (kg).
    pub mass: f64,
    /// What it meets.
    pub resistance: Resistance,
    /// The forces of stages that have no coefficients, each with the index of its stage, from 0.
    pub forces: Vec<(usize, Force)>,
    /// The ends of stages that are no depths, each with the index of its stage, from 0.
    pub ends: Vec<(usize, OwnEnd)>,
    /// Target thickness H (m), with layers their sum; `None` for a semi-infinite target.
    pub thickness: Option<f64>,
    /// When it counts as perforated.
    pub criterion: Criterion,
    /// The plug of the criterion [`Criterion::Plug`].
    pub plug: Option<Plug>,
    /// Impact velocity V0 (m/s), where the scene gives one.
    pub velocity: Option<f64>,
    /// The quantities that expressions use by name.
    pub parameters: Vec<OwnParameter>,
}

/// The values that a number of a scene may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Range {
    /// Any finite number.
    Finite,
    /// Finite and >= 0.
    NotNegative,
    /// Finite and > 0.
    Positive,
    /// 0 to 1, both included.
    UnitInterval,
    /// Finite and >= 0.5.
    AtLeastHalf,
    /// 0 to below 90.
    BelowRightAngle,
}

impl Range {
    /// Whether `value` is allowed; NaN and the infinities never are.
    pub fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::NotNegative => value >= 0.0,
                Self::Positive => value > 0.0,
                Self::UnitInterval => (0.0..=1.0).contains(&value),
                Self::AtLeastHalf => value >= 0.5,
                Self::BelowRightAngle => (0.0..90.0).contains(&value),
            }
    }

    /// What is allowed, for people: `a number > 0`.
    pub fn description(self) -> &'static str {
        match self {
            Self::Finite => "any finite number",
            Self::NotNegative => "a number >= 0",
            Self::Positive => "a number > 0",
            Self::UnitInterval => "a number from 0 to 1",
            Self::AtLeastHalf => "a number >= 0.5",
            Self::BelowRightAngle => "degrees from 0 to below 90",
        }
    }

    /// A number in the range, as a person might write it.
    pub fn example(self) -> &'static str {
        match self {
            Self::UnitInterval => "0.72",
            _ => "2.0",
        }
    }
}

/// What follows from the numbers of a scene.
pub type Resolved<T = Problem> = Result<T, ResolveError>;

/// Why a scene has no equation of motion.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ResolveError {
    /// A number outside its range.
    #[error("{} = {} is not admissible: it must be {}", .parameter.label(), Shown(*.value), .parameter.entry().range.description())]
    Inadmissible {
        /// Which number.
        parameter: Parameter,
        /// Value given.
        value: f64,
    },
    /// The scene gives no impact velocity, and none was asked for.
    #[error("the scene gives no impact velocity")]
    NoImpactSpeed,
    /// The criterion `ndrc` on a scene without a diameter.
    #[error("the criterion `ndrc` needs a projectile diameter, and a scene of stages has none")]
    NoDiameter,
    /// The criterion `plug` on a scene that lacks what it needs.
    #[error("the criterion `plug` needs a slab of one concrete with a thickness, a half angle and a shear strength")]
    NoPlug,
    /// No stage at all.
    #[error("the scene has no stage")]
    NoStage,
    /// A stage ends before the one in front of it.
    #[error("stage {stage} ends at {} m, before the stage in front of it ends at {} m", Shown(*.end), Shown(*.previous))]
    StageEndsFall {
        /// Index of the stage, from 0.
        stage: usize,
        /// Its end (m).
        end: f64,
        /// End of the stage before it (m); infinite when that has no end.
        previous: f64,
    },
    /// A table begins behind the start of its stage, or ends there.
    #[error("the table of stage {stage} goes from x = {} m to {} m, and the stage begins at {} m", Shown(*.first), Shown(*.last), Shown(*.start))]
    TableElsewhere {
        /// Index of the stage, from 0.
        stage: usize,
        /// Depth of the first row (m).
        first: f64,
        /// Depth of the last row (m).
        last: f64,
        /// Where the stage begins (m).
        start: f64,
    },
    /// A stage has a table of depth for its force, and a condition for its end; or one of velocity, and an equation.
    #[error("stage {0} has a table for its force, and ends on a condition")]
    TableOnCondition(usize),
    /// The last stage ends on a condition.
    #[error("stage {0} ends on a condition, or a mass joins there, and no stage follows")]
    NothingFollows(usize),
    /// The last stage ends inside the target.
    #[error("the last stage ends at {} m, inside the target", Shown(*.0))]
    TargetGoesOn(f64),
    /// The thickness of a layered target is not the sum of its layers.
    #[error("the layers sum up to {} m, the target's thickness says {} m", Shown(*.sum), Shown(*.thickness))]
    LayersDoNotSumUp {
        /// Sum of the layers (m); infinite when the last has no end.
        sum: f64,
        /// Thickness of the target (m); infinite when absent.
        thickness: f64,
    },
    /// Two depths that 64-bit numbers do not tell apart as the decimals do, of which one would decide the force.
    #[error("{0} lie so close that rounding decides which comes first")]
    ChosenByRounding(&'static str),
    /// A coefficient overflows, or underflows to where its digits are lost.
    #[error("{quantity} comes to {}, beyond the range of 64-bit numbers", Shown(*.value))]
    OutOfRange {
        /// Which coefficient, with its unit.
        quantity: &'static str,
        /// What its formula gives.
        value: f64,
    },
}

impl Advice for ResolveError {
    fn is_usage(&self) -> bool {
        !matches!(self, Self::OutOfRange { .. })
    }

    fn help(&self) -> String {
        match self {
            Self::Inadmissible { .. } => "give a value in the range",
            Self::NoImpactSpeed => "add [impact] with velocity = \"300 m/s\"",
            Self::NoPlug => {
                "give [target] a thickness and [perforation] half_angle and shear_strength, or take `full-depth`"
            }
            Self::NoDiameter => "take the criterion `full-depth`",
            Self::NoStage => "give at least one stage",
            Self::StageEndsFall { .. } => "order the stages by their ends, and leave out only the last end",
            Self::TableElsewhere { .. } => "add a row at or before the start of the stage, and one behind it",
            Self::TableOnCondition(_) => "write the force as an expression, or end the stage at a depth",
            Self::NothingFollows(_) => "add the stage that follows",
            Self::TargetGoesOn(_) => "leave out the end of the last stage, or end the target there",
            Self::LayersDoNotSumUp { .. } => "leave out the thickness; it follows from the layers",
            Self::ChosenByRounding(_) => "move one of them by 1e-15 of itself, or take --method taylor",
            Self::OutOfRange { .. } => "check the units of the scene; its numbers lie too far apart",
        }
        .to_owned()
    }
}

/// `number`, unless its value overflowed or is subnormal; zero is accepted where a factor is `zero`.
fn representable<S: Scalar>(quantity: &'static str, number: S, zero: bool) -> Resolved<S> {
    let value = number.value();
    if value.is_normal() || (zero && value == 0.0) {
        Ok(number)
    } else {
        Err(ResolveError::OutOfRange { quantity, value })
    }
}

/// [`Stage::continuous_crater`], unless its constant leaves the range of numbers.
fn continuous_crater<S: Scalar>(depth: S, beyond: &Stage<S>, mass: S, impact_speed: S) -> Resolved<Stage<S>> {
    let crater = Stage::continuous_crater(depth, beyond, mass, impact_speed);
    // No force at k d (an air gap there) leaves no force in the crater.
    let force = beyond.static_force + beyond.drag * impact_speed * impact_speed;
    representable("the crater stiffness c [N/m]", crater.stiffness, force.value() == 0.0)?;
    Ok(crater)
}

/// The value of a number as it is.
fn plain(_: Parameter, value: f64) -> f64 {
    value
}

/// The number `which` of a target of one medium; the others are in no scene.
fn of_one_medium(which: LayerNumber) -> Parameter {
    match which {
        LayerNumber::Strength => Parameter::Strength,
        LayerNumber::Density => Parameter::Density,
        LayerNumber::StaticFactor => Parameter::StaticFactor,
        LayerNumber::Thickness | LayerNumber::Viscosity => Parameter::Layer(0, which),
    }
}

/// Index of the layer that holds `depth` (m) just beyond it, of the last where all end before; `None` without layers.
pub(crate) fn layer_beyond(layers: &[Layer], depth: f64) -> Option<usize> {
    let mut end = 0.0;
    let holds = |layer: &Layer| {
        end += layer.thickness;
        end > depth
    };
    layers.iter().position(holds).or(layers.len().checked_sub(1))
}

impl Concrete {
    /// S of a concrete of compressive strength `strength` (Pa) for which none is given (Eq. 14).
    ///
    /// # Errors
    /// [`ResolveError::Inadmissible`] for a strength that is not positive.
    pub fn usual_static_factor(strength: f64) -> Resolved<f64> {
        Parameter::Strength.admit(strength)?;
        Ok(semi_empirical::static_factor(strength))
    }

    /// Its S by Eq. 14 for a shot of `speed` (m/s).
    pub fn use_of_eq14(&self, speed: f64) -> UseOfEq14 {
        UseOfEq14 { strength: self.strength, diameter: self.diameter, speed }
    }

    /// Crater depth k d (m).
    pub fn crater_depth(&self) -> f64 {
        self.crater_ratio * self.diameter
    }

    /// Tunnel stage of one medium (Eq. 5): `P = (pi d²/4) S fc`, `Q = (pi d²/4) N* B rho`.
    ///
    /// The factors are paired so that no product overflows before the result does.
    fn tunnel<S: Scalar>(
        &self,
        medium: &Layer,
        name: impl Fn(LayerNumber) -> Parameter,
        end: S,
        number: &impl Fn(Parameter, f64) -> S,
    ) -> Resolved<Stage<S>> {
        let of_medium = |which: LayerNumber| number(name(which), which.of(*medium));
        let (d, area) = (number(Parameter::Diameter, self.diameter), S::quarter_pi());
        let static_force = area * (of_medium(LayerNumber::StaticFactor) * d) * (of_medium(LayerNumber::Strength) * d);
        let no_force = medium.static_factor == 0.0 || medium.strength == 0.0;
        let nose =
            number(Parameter::NoseFactor, self.nose_factor) * number(Parameter::InertiaFactor, self.inertia_factor);
        let drag = area * (nose * d) * (of_medium(LayerNumber::Density) * d);
        let no_drag = self.nose_factor == 0.0 || self.inertia_factor == 0.0 || medium.density == 0.0;
        Ok(Stage {
            static_force: representable("the static force P [N]", static_force, no_force)?,
            stiffness: S::zero(),
            viscosity: of_medium(LayerNumber::Viscosity),
            drag: representable("the drag Q [kg/m]", drag, no_drag)?,
            end,
        })
    }

    /// The media behind x = k d, as stages; never empty.
    ///
    /// Layer ends before k d are no boundaries of the force. A target no thicker than k d is continued by its last
    /// layer, as a homogeneous one is by itself.
    fn beyond_crater<S: Scalar>(&self, number: &impl Fn(Parameter, f64) -> S) -> Resolved<Stages<S>> {
        let (mut stages, infinite) = (Stages::new(), S::from_f64(f64::INFINITY));
        let Some(first) = layer_beyond(&self.layers, self.crater_depth()) else {
            let medium = Layer {
                thickness: f64::INFINITY,
                strength: self.strength,
                density: self.density,
                static_factor: self.static_factor,
                follows_eq14: self.follows_eq14,
                viscosity: 0.0,
            };
            stages.push(self.tunnel(&medium, of_one_medium, infinite, number)?);
            return Ok(stages);
        };
        let last = self.layers.len() - 1;
        let mut end = S::zero();
        for (index, layer) in self.layers.iter().enumerate() {
            let name = |which| Parameter::Layer(index, which);
            end += number(name(LayerNumber::Thickness), layer.thickness);
            if index >= first {
                stages.push(self.tunnel(layer, name, if index == last { infinite } else { end }, number)?);
            }
        }
        Ok(stages)
    }

    /// The stages at `impact_speed` (m/s), and the index of the crater's.
    fn stages<S: Scalar>(
        &self,
        mass: S,
        impact_speed: S,
        number: &impl Fn(Parameter, f64) -> S,
    ) -> Resolved<(Stages<S>, Option<usize>)> {
        let mut stages = self.beyond_crater(number)?;
        if self.crater_ratio == 0.0 {
            return Ok((stages, None));
        }
        let depth = number(Parameter::CraterRatio, self.crater_ratio) * number(Parameter::Diameter, self.diameter);
        let depth = representable("the crater depth k d [m]", depth, false)?;
        let crater = match self.crater_stiffness {
            CraterStiffness::Given(stiffness) => Stage::crater(number(Parameter::CraterStiffness, stiffness), depth),
            CraterStiffness::Continuous => continuous_crater(depth, &stages[0], mass, impact_speed)?,
        };
        stages.insert(0, crater);
        Ok((stages, Some(0)))
    }

    fn check(&self, thickness: Option<f64>) -> Resolved<()> {
        Parameter::Diameter.admit(self.diameter)?;
        Parameter::NoseFactor.admit(self.nose_factor)?;
        Parameter::InertiaFactor.admit(self.inertia_factor)?;
        Parameter::CraterRatio.admit(self.crater_ratio)?;
        if let CraterStiffness::Given(stiffness) = self.crater_stiffness {
            Parameter::CraterStiffness.admit(stiffness)?;
        }
        let Some((last, inner)) = self.layers.split_last() else {
            Parameter::Strength.admit(self.strength)?;
            Parameter::Density.admit(self.density)?;
            return Parameter::StaticFactor.admit(self.static_factor);
        };
        let mut sum = 0.0;
        for (index, layer) in inner.iter().enumerate() {
            layer.check(index, layer.thickness)?;
            sum += layer.thickness;
        }
        // Only the last layer may be infinite.
        last.check(inner.len(), if last.thickness == f64::INFINITY { 0.0 } else { last.thickness })?;
        sum += last.thickness;
        let thickness = thickness.unwrap_or(f64::INFINITY);
        if sum == thickness { Ok(()) } else { Err(ResolveError::LayersDoNotSumUp { sum, thickness }) }
    }
}

impl Layer {
    /// Checks the layer `index`, its thickness as `thickness`.
    fn check(&self, index: usize, thickness: f64) -> Resolved<()> {
        let layer = Self { thickness, ..*self };
        LayerNumber::ALL.into_iter().try_for_each(|which| Parameter::Layer(index, which).admit(which.of(layer)))
    }
}

/// The stage that `tape` is, if it is `p + s x + r V + q V²` with coefficients that a stage may have. One that brings nothing to rest stays
/// a law: what it approaches then follows from the power of V, to the digits of V_c.
fn of_coefficients<S: Scalar>(tape: &Tape, parameters: &[S]) -> Option<Stage<S>> {
    let [static_force, stiffness, viscosity, drag] = tape.coefficients(parameters)?;
    let stage = Stage { static_force, stiffness, viscosity, drag, ..Stage::free() };
    let is_one = [static_force, stiffness, viscosity, drag].map(S::value);
    let is_representable = is_one.iter().all(|value| value.is_normal() || *value == 0.0);
    let rests = is_one[0] != 0.0 || is_one[1] != 0.0;
    (is_representable && rests && is_one[1..].iter().all(|value| *value >= 0.0)).then_some(stage)
}

/// Stages given directly, the last without an end.
fn given<S: Scalar>(
    scene: &Scene,
    stages: &[Stage],
    exit_depth: f64,
    number: &impl Fn(Parameter, f64) -> S,
) -> Resolved<Stages<S>> {
    let mut previous = 0.0;
    for (index, stage) in stages.iter().enumerate() {
        let has_law = matches!(scene.force_of(index), Some(Force::Expression(_) | Force::SpeedTable(_)));
        for which in [StageNumber::StaticForce, StageNumber::Stiffness, StageNumber::Viscosity, StageNumber::Drag] {
            if has_law {
                break;
            }
            let (parameter, value) = (Parameter::Stage(index, which), which.of(*stage));
            parameter.admit(value)?;
            // A subnormal number has lost digits already, and any product with it loses more.
            representable(parameter.entry().name, value, true)?;
        }
        if let Some(end) = scene.end_of(index) {
            for which in [StageNumber::EndVelocity, StageNumber::AddMass] {
                end.number(which).map_or(Ok(()), |value| Parameter::Stage(index, which).admit(value))?;
            }
            if index + 1 == stages.len() {
                return Err(ResolveError::NothingFollows(index));
            }
            let has_table = match scene.force_of(index) {
                Some(Force::Table(_)) => end.condition.is_some(),
                Some(Force::SpeedTable(_)) => matches!(end.condition, Some(Ending::Until(_))),
                _ => false,
            };
            if has_table {
                return Err(ResolveError::TableOnCondition(index));
            }
            if stage.end == f64::INFINITY && end.condition.is_some() {
                continue;
            }
        }
        // In this form it also refuses NaN, and a stage behind one without an end.
        if !(stage.end >= previous && previous.is_finite()) {
            return Err(ResolveError::StageEndsFall { stage: index, end: stage.end, previous });
        }
        previous = stage.end;
    }
    if stages.is_empty() {
        return Err(ResolveError::NoStage);
    }
    if previous < exit_depth {
        return Err(ResolveError::TargetGoesOn(previous));
    }
    let lifted = |(index, stage): (usize, &Stage)| {
        let of = |which: StageNumber| number(Parameter::Stage(index, which), which.of(*stage));
        Stage {
            static_force: of(StageNumber::StaticForce),
            stiffness: of(StageNumber::Stiffness),
            viscosity: of(StageNumber::Viscosity),
            drag: of(StageNumber::Drag),
            // The last end, at or behind the exit, is never crossed.
            end: if index + 1 == stages.len() { S::from_f64(f64::INFINITY) } else { of(StageNumber::End) },
        }
    };
    Ok(stages.iter().enumerate().map(lifted).collect())
}

impl Scene {
    /// A projectile of `mass` (kg) and a target of `concrete` without a far side; no impact velocity, the full depth as
    /// criterion.
    pub fn of_concrete(mass: f64, concrete: Concrete) -> Self {
        Self {
            title: None,
            mass,
            resistance: Resistance::Concrete(concrete),
            forces: Vec::new(),
            ends: Vec::new(),
            thickness: None,
            criterion: Criterion::FullDepth,
            plug: None,
            velocity: None,
            parameters: Vec::new(),
        }
    }

    /// The equation of motion at `impact_speed` [m/s]: stages and exit depth (docs/theory.md, section 1).
    ///
    /// ```text
    /// crater  s = c until k d,   c = M (P + Q V0²)/(k d (M + k d Q)) or given
    /// tunnel  p = P = (pi d²/4) S fc,   q = Q = (pi d²/4) N* B rho
    /// ```
    ///
    /// The continuous c depends on the impact speed, so a scene resolves anew for each. `k = 0` leaves out the crater.
    /// In layers P and Q of the crater's c are those of the layer that holds x = k d just beyond it. Coefficients are
    /// accurate to 5 ulp.
    ///
    /// # Errors
    /// [`ResolveError`]: a number of the scene or the speed is not admissible, or a coefficient leaves the range of
    /// normal `f64` numbers. A problem never holds NaN, nor an infinity other than an absent end.
    pub fn resolve(&self, impact_speed: f64) -> Resolved {
        self.resolve_in(impact_speed, plain)
    }

    /// As [`Scene::resolve`], in the number type into which `number` lifts each number of the scene.
    ///
    /// With dual numbers, `number` says which of them has a derivative.
    ///
    /// # Errors
    /// As [`Scene::resolve`].
    pub fn resolve_in<S: Scalar>(
        &self,
        impact_speed: f64,
        number: impl Fn(Parameter, f64) -> S,
    ) -> Resolved<Problem<S>> {
        Parameter::Velocity.admit(impact_speed)?;
        Parameter::Mass.admit(self.mass)?;
        let mass = representable("the mass M [kg]", number(Parameter::Mass, self.mass), false)?;
        let impact_speed = number(Parameter::Velocity, impact_speed);
        let exit_depth = self.exit_depth_in(&number)?;
        let (stages, crater, target) = match &self.resistance {
            Resistance::Stages(stages) => {
                let given = given(self, stages, exit_depth.value(), &number)?;
                let (stages, laws, ends) = self.with_forces(&given, exit_depth.value(), &number)?;
                let (exit_depth, target) = if ends {
                    (S::from_f64(f64::INFINITY), Target::StagesToEndOfTable)
                } else {
                    (exit_depth, Target::Stages)
                };
                return Ok(Problem { mass, impact_speed, exit_depth, stages, crater: None, target, laws });
            }
            Resistance::Concrete(concrete) => {
                concrete.check(self.thickness)?;
                let (stages, crater) = concrete.stages(mass, impact_speed, &number)?;
                let target = if concrete.layers.is_empty() { Target::CraterAndTunnel } else { Target::Stages };
                (stages, crater, target)
            }
        };
        let (stages, laws) = match self.criterion {
            Criterion::Plug => self.with_plug(&stages, exit_depth, &number)?,
            _ => (stages, Laws::none()),
        };
        Ok(Problem { mass, impact_speed, exit_depth, stages, crater, target, laws })
    }

    /// `stages`, each of which ends where the plug breaks off too, and that of the plug behind them.
    #[cold]
    fn with_plug<S: Scalar>(
        &self,
        stages: &[Stage<S>],
        thickness: S,
        number: &impl Fn(Parameter, f64) -> S,
    ) -> Resolved<(Stages<S>, Laws<S>)> {
        let (Some(plug), Some(concrete), true) = (self.plug, self.concrete(), thickness.value() < f64::INFINITY) else {
            return Err(ResolveError::NoPlug);
        };
        if !concrete.layers.is_empty() {
            return Err(ResolveError::NoPlug);
        }
        Parameter::HalfAngle.admit(plug.half_angle)?;
        Parameter::ShearStrength.admit(plug.shear_strength)?;
        let degree = S::quarter_pi().over(S::from_f64(45.0));
        let angle = number(Parameter::HalfAngle, plug.half_angle) * degree;
        let slab = Slab {
            thickness,
            diameter: number(Parameter::Diameter, concrete.diameter),
            density: number(Parameter::Density, concrete.density),
            shear_strength: number(Parameter::ShearStrength, plug.shear_strength),
            tangent: angle.sin().over(angle.cos()),
        };
        let laws = stages.iter().map(|stage| Some(slab.breaking(stage, stages.len())));
        let laws: Laws<S> = laws.chain([Some(slab.moving())]).collect();
        let places = stages.iter().map(|stage| Stage::of_law(stage.end));
        Ok((places.chain([Stage::of_law(S::from_f64(f64::INFINITY))]).collect(), laws))
    }

    /// The force of stage `index` that is no coefficients.
    pub fn force_of(&self, index: usize) -> Option<&Force> {
        self.forces.iter().find(|(stage, _)| *stage == index).map(|(_, force)| force)
    }

    /// The same scene with another criterion, and no plug.
    #[must_use]
    pub fn judged_by(&self, criterion: Criterion) -> Self {
        Self { criterion, plug: None, ..self.clone() }
    }

    /// The same target judged by other criteria, with their names, for a scene with the criterion `plug`: x = H, `x_p(H)`, and
    /// `H - H*`, where the static resistance breaks the plug off; none for any other scene.
    pub fn other_criteria(&self) -> Vec<(&'static str, Self)> {
        let (Some(plug), Some(concrete), Some(thickness), Some(tunnel)) =
            (self.plug, self.concrete(), self.thickness, self.tunnel())
        else {
            return Vec::new();
        };
        let left = plug.static_thickness(tunnel.static_force, concrete.diameter);
        let full = self.judged_by(Criterion::FullDepth);
        let fixed = Self { thickness: Some((thickness - left).max(0.0)), ..full.clone() };
        vec![("full-depth", full), ("ndrc", self.judged_by(Criterion::Ndrc)), ("static plug", fixed)]
    }

    /// Whether a stage ends at a speed or on a condition, or a mass joins: a plug among them.
    pub fn has_conditions(&self) -> bool {
        !self.ends.is_empty() || self.criterion == Criterion::Plug
    }

    /// How stage `index` ends besides at a depth.
    pub fn end_of(&self, index: usize) -> Option<&OwnEnd> {
        self.ends.iter().find(|(stage, _)| *stage == index).map(|(_, end)| end)
    }

    /// `stages` and `laws`, the conditions of [`Scene::ends`] at the stages that `pieces` tells of each given stage: every
    /// stage has a law then, so that what knows coefficients alone refuses it.
    fn with_ends<S: Scalar>(
        &self,
        mut stages: Stages<S>,
        mut laws: Vec<Option<Law<S>>>,
        pieces: &[std::ops::Range<usize>],
        parameters: &[S],
        number: &impl Fn(Parameter, f64) -> S,
    ) -> (Stages<S>, Laws<S>) {
        if self.ends.is_empty() {
            return (stages, laws.into_iter().collect());
        }
        laws.resize_with(stages.len(), || None);
        for (stage, law) in stages.iter_mut().zip(&mut laws) {
            if law.is_none() {
                *law = Some(Law::of_coefficients(stage));
                *stage = Stage::of_law(stage.end);
            }
        }
        for (index, end) in &self.ends {
            let Some(range) = pieces.get(*index) else { continue };
            let next = range.end;
            let condition = end.condition.as_ref().map(|condition| match condition {
                Ending::Velocity(velocity) => {
                    let which = Parameter::Stage(*index, StageNumber::EndVelocity);
                    Condition::of_speed(number(which, *velocity), next)
                }
                Ending::Until(tape) => Condition::of_zero(tape, parameters.to_vec(), next),
            });
            if let Some(condition) = condition {
                for law in &mut laws[range.clone()] {
                    *law = law.take().map(|law| law.ending(condition.clone()));
                }
            }
            if let (Some(mass), Some(law)) = (end.add_mass, laws.get_mut(next)) {
                let mass = number(Parameter::Stage(*index, StageNumber::AddMass), mass);
                *law = law.take().map(|law| law.joined_by(mass_itself(), vec![mass]));
            }
        }
        (stages, laws.into_iter().collect())
    }

    /// `given` with the pieces of tables of depth in place of their stages, and the laws of stages whose force is an expression or a
    /// table of velocity; and whether a table of depth ends before its stage and the exit, so that the last stage stands for what lies behind it.
    fn with_forces<S: Scalar>(
        &self,
        given: &[Stage<S>],
        exit_depth: f64,
        number: &impl Fn(Parameter, f64) -> S,
    ) -> Resolved<(Stages<S>, Laws<S>, bool)> {
        if self.forces.is_empty() && self.ends.is_empty() {
            return Ok((Stages::from_slice(given), Laws::none(), false));
        }
        let parameters: Vec<S> =
            self.parameters.iter().map(|one| number(Parameter::Own(one.name), one.value)).collect();
        let (mut stages, mut laws) = (Stages::new(), Vec::new());
        let mut pieces = Vec::with_capacity(given.len());
        let mut ends_early = false;
        for (index, stage) in given.iter().enumerate() {
            laws.resize_with(stages.len(), || None);
            let first = stages.len();
            let table = match self.force_of(index) {
                Some(Force::Table(table)) => table,
                other => {
                    let end = stage.end;
                    match other {
                        Some(Force::Expression(tape))
                            if self.ends.is_empty()
                                && let Some(stage) = of_coefficients(tape, &parameters) =>
                        {
                            stages.push(Stage { end, ..stage });
                            pieces.push(first..first + 1);
                            continue;
                        }
                        Some(Force::Expression(tape)) => laws.push(Some(Law::new(tape, parameters.clone()))),
                        Some(Force::SpeedTable(table)) => {
                            laws.push(Some(Law::of_table(table.clone())));
                        }
                        _ => {}
                    }
                    stages.push(*stage);
                    pieces.push(first..first + 1);
                    continue;
                }
            };
            let places = given[..index].iter().rev().map(|before| before.end.value());
            let start = places.into_iter().find(|end| *end < f64::INFINITY).unwrap_or(0.0);
            let end = stage.end.value();
            if !(table.first() <= start && start < table.last()) {
                let (first, last) = (table.first(), table.last());
                return Err(ResolveError::TableElsewhere { stage: index, first, last, start });
            }
            if end <= start {
                stages.push(*stage);
                pieces.push(first..first + 1);
                continue;
            }
            let mut reached = start;
            for piece in table.stages_in::<S>(start) {
                representable("the stiffness between two rows of a table [N/m]", piece.stiffness, true)?;
                representable("the static force of a piece of a table [N]", piece.static_force, true)?;
                reached = piece.end.value();
                let is_last = reached >= end;
                let until = if is_last { stage.end } else { piece.end };
                stages.push(Stage { end: until, ..piece });
                if is_last || reached >= exit_depth {
                    break;
                }
            }
            pieces.push(first..stages.len());
            if reached >= exit_depth && reached < end {
                // Nothing behind the exit is met.
                if let Some(last) = stages.last_mut() {
                    last.end = S::from_f64(f64::INFINITY);
                }
                break;
            }
            if reached < end {
                stages.push(Stage::free());
                ends_early = true;
                break;
            }
        }
        let (stages, laws) = self.with_ends(stages, laws, &pieces, &parameters, number);
        Ok((stages, laws, ends_early))
    }

    /// Whether it has forces of its own, and is `other` but for the speed.
    pub(crate) fn has_laws_of(&self, other: &Self) -> bool {
        let Self { title: _, velocity: _, mass, resistance, forces, ends, thickness, criterion, plug, parameters } =
            self;
        !forces.is_empty()
            && (*mass, *thickness, *criterion, *plug) == (other.mass, other.thickness, other.criterion, other.plug)
            && *parameters == other.parameters
            && *resistance == other.resistance
            && *forces == other.forces
            && *ends == other.ends
    }

    /// As [`Scene::resolve`], from the `problem` of this scene at another speed: only a continuous crater constant depends
    /// on the speed.
    ///
    /// # Errors
    /// As [`Scene::resolve`].
    pub(crate) fn resolve_from(&self, problem: &Problem, impact_speed: f64) -> Resolved {
        if self.criterion == Criterion::Plug {
            return self.resolve(impact_speed);
        }
        Parameter::Velocity.admit(impact_speed)?;
        // A clone of the list would go stage by stage.
        let stages = Stages::from_slice(&problem.stages);
        let mut problem = Problem { impact_speed, stages, laws: problem.laws.clone(), ..*problem };
        let continuous = self.concrete().is_some_and(|c| c.crater_stiffness == CraterStiffness::Continuous);
        if let (Some(crater), true) = (problem.crater, continuous) {
            let stages = &mut problem.stages;
            stages[crater] = continuous_crater(stages[crater].end, &stages[crater + 1], self.mass, impact_speed)?;
        }
        Ok(problem)
    }

    /// The equation of motion at the scene's own impact velocity.
    ///
    /// # Errors
    /// [`ResolveError::NoImpactSpeed`] without one; else as [`Scene::resolve`].
    pub fn problem(&self) -> Resolved {
        self.resolve(self.velocity.ok_or(ResolveError::NoImpactSpeed)?)
    }

    /// The concrete of the scene; `None` for a scene of stages.
    pub fn concrete(&self) -> Option<&Concrete> {
        match &self.resistance {
            Resistance::Concrete(concrete) => Some(concrete),
            Resistance::Stages(_) => None,
        }
    }

    /// The law just beyond the crater; `None` for a scene of stages, or beyond the range of numbers.
    pub fn tunnel(&self) -> Option<Stage> {
        Some(self.concrete()?.beyond_crater(&plain).ok()?[0])
    }

    /// Depth that perforates (m): H, or `x_p(H)` by the ACE/NDRC relation; infinite for a semi-infinite target.
    ///
    /// # Errors
    /// [`ResolveError`]: the thickness or the diameter is not admissible, the criterion `ndrc` has no diameter to go
    /// by, or the depth leaves the range of `f64`.
    fn exit_depth_in<S: Scalar>(&self, number: &impl Fn(Parameter, f64) -> S) -> Resolved<S> {
        let diameter = match self.criterion {
            Criterion::FullDepth | Criterion::Plug => None,
            Criterion::Ndrc => Some(self.concrete().ok_or(ResolveError::NoDiameter)?.diameter),
        };
        let Some(given) = self.thickness else { return Ok(S::from_f64(f64::INFINITY)) };
        Parameter::Thickness.admit(given)?;
        let thickness = number(Parameter::Thickness, given);
        let Some(diameter) = diameter else { return Ok(thickness) };
        Parameter::Diameter.admit(diameter)?;
        let diameter = number(Parameter::Diameter, diameter);
        let depth = diameter * semi_empirical::perforating_depth_ratio(thickness / diameter);
        representable("the exit depth x_p [m]", depth, given == 0.0)
    }

    /// A warning if the criterion `ndrc` is used beyond the range of its relation, H/d = 18.06.
    pub fn exit_depth_warning(&self) -> Option<String> {
        if self.criterion != Criterion::Ndrc {
            return None;
        }
        let validity = semi_empirical::perforation_validity(self.thickness? / self.concrete()?.diameter);
        (!validity.valid).then_some(validity.note)
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a missing value is a failed test")]
mod tests;
