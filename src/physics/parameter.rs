//! The numbers of a scene: one table of their paths, symbols, units, ranges and defaults.
//!
//! A path such as `target.strength` names the number as the scene file does. The table serves the keys of scene files,
//! what a sweep varies and a spread blurs, the columns of a table of scenes, and the checks of [`Scene::resolve`].
//! Three groups (docs/theory.md, section 1) are paths too, each with the one number that it sets: `H/d` the thickness,
//! `I` the impact velocity, `N` the density.
//!
//! Where a scene states no S, S follows the strength by Eq. 14: `target.strength` then stands for both. A stated S stays,
//! also where it equals that of Eq. 14.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::advice::Advice;
use super::expression::Unit;
use super::law::{Name, OwnParameter};
use super::problem::Stage;
use super::scene::Resistance::{Concrete, Stages};
use super::scene::{CraterStiffness, Layer, Range, ResolveError, Resolved, Scene};
use super::units::{Dimension, Quantity, QuantityError, number, quantity, split};
use super::{groups, semi_empirical};

/// A number of a scene, or a group of them.
///
/// The order is the one in which several are set: S after the strength that it may follow, groups after the numbers
/// they are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Parameter {
    /// Projectile mass M (kg).
    Mass,
    /// Projectile diameter d (m).
    Diameter,
    /// Nose factor N*.
    NoseFactor,
    /// Unconfined compressive strength fc (Pa).
    Strength,
    /// Target density rho (kg/m³).
    Density,
    /// Target thickness H (m).
    Thickness,
    /// Static strength over fc, S.
    StaticFactor,
    /// Inertia factor B.
    InertiaFactor,
    /// Crater depth in diameters, k.
    CraterRatio,
    /// Crater constant c (N/m), where it is given.
    CraterStiffness,
    /// Impact velocity V0 (m/s).
    Velocity,
    /// Half angle of the plug (degrees).
    HalfAngle,
    /// Shear strength around the plug (Pa).
    ShearStrength,
    /// A number of the layer `.0`, counted from 0.
    Layer(usize, LayerNumber),
    /// A number of the stage `.0`, counted from 0.
    Stage(usize, StageNumber),
    /// A parameter of a law of one's own, in SI units.
    Own(Name),
    /// H/d, which sets the thickness.
    ThicknessRatio,
    /// Geometry function N, which sets the density.
    Geometry,
    /// Impact function I, which sets the impact velocity.
    Impact,
}

/// A number of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "named as in the scene file")]
pub enum LayerNumber {
    Thickness,
    Strength,
    Density,
    StaticFactor,
    Viscosity,
}

/// A number of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "named as in the scene file")]
pub enum StageNumber {
    StaticForce,
    Stiffness,
    Viscosity,
    Drag,
    End,
    EndVelocity,
    AddMass,
}

/// What the table holds on one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Path; `*` stands for the index of a layer or a stage.
    pub path: &'static str,
    /// Name and symbol: `mass M`.
    pub name: &'static str,
    /// Dimension; `None` for a plain number.
    pub dimension: Option<Dimension>,
    /// Admissible values.
    pub range: Range,
    /// What a scene means that leaves it out.
    pub absence: Absence,
}

/// What a scene means that leaves a number out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Absence {
    /// Nothing: the number is required. The text is an example, as a scene file has it.
    Refused(&'static str),
    /// This value.
    Is(f64),
    /// What the text says.
    Means(&'static str),
}

impl Parameter {
    /// Every number with a path of its own, groups last.
    pub const PLAIN: [Self; 16] = [
        Self::Mass,
        Self::Diameter,
        Self::NoseFactor,
        Self::Strength,
        Self::Density,
        Self::Thickness,
        Self::StaticFactor,
        Self::InertiaFactor,
        Self::CraterRatio,
        Self::CraterStiffness,
        Self::Velocity,
        Self::HalfAngle,
        Self::ShearStrength,
        Self::ThicknessRatio,
        Self::Geometry,
        Self::Impact,
    ];

    /// What the table holds on it: the one place for path, symbol, dimension, range and default of a number.
    #[inline]
    pub const fn entry(self) -> Entry {
        use Absence::{Is, Means, Refused};
        use Dimension::{Density, Drag, Force, Length, Mass, Pressure, Stiffness, Velocity, Viscosity};
        use LayerNumber as L;
        use Range::{BelowRightAngle, Finite, NotNegative, Positive, UnitInterval};
        use StageNumber as S;
        const GROUP: Absence = Means("what its numbers give");
        const CONTINUOUS: Absence = Means("a force continuous at x = k d");
        const THICK: Absence = Refused("\"100 mm\": only the last layer goes without");
        let (path, name, dimension, range, absence) = match self {
            Self::Mass => ("projectile.mass", "mass M", Some(Mass), Positive, Refused("\"2 kg\"")),
            Self::Diameter => ("projectile.diameter", "diameter d", Some(Length), Positive, Refused("\"50 mm\"")),
            Self::NoseFactor => ("projectile.nose.factor", "nose factor N*", None, UnitInterval, Refused("0.72")),
            Self::Strength => ("target.strength", "strength fc", Some(Pressure), Positive, Refused("\"36 MPa\"")),
            Self::Density => ("target.density", "density rho", Some(Density), NotNegative, Refused("\"2300 kg/m^3\"")),
            Self::Thickness => ("target.thickness", "thickness H", Some(Length), NotNegative, Means("semi-infinite")),
            Self::StaticFactor => ("resistance.S", "static factor S", None, Positive, Means("Eq. 14")),
            Self::InertiaFactor => ("resistance.B", "inertia factor B", None, NotNegative, Is(1.0)),
            Self::CraterRatio => ("resistance.k", "crater ratio k", None, NotNegative, Is(2.0)),
            Self::CraterStiffness => {
                ("resistance.crater_stiffness", "crater stiffness c", Some(Stiffness), Positive, CONTINUOUS)
            }
            Self::Velocity => {
                let example = Refused("\"300 m/s\", or drop [impact]");
                ("impact.velocity", "impact speed V0", Some(Velocity), NotNegative, example)
            }
            Self::HalfAngle => {
                ("perforation.half_angle", "half angle of the plug [deg]", None, BelowRightAngle, Refused("\"60 deg\""))
            }
            Self::ShearStrength => {
                ("perforation.shear_strength", "shear strength tau", Some(Pressure), Positive, Refused("\"20 MPa\""))
            }
            Self::Layer(_, L::Thickness) => {
                ("target.layer.*.thickness", "thickness h", Some(Length), NotNegative, THICK)
            }
            // Zero strength is an air gap; zero S is what Eq. 14 leaves to one, and no file gives it.
            Self::Layer(_, L::Strength) => {
                return Entry { path: "target.layer.*.strength", range: NotNegative, ..Self::Strength.entry() };
            }
            Self::Layer(_, L::StaticFactor) => {
                return Entry { path: "target.layer.*.S", range: NotNegative, ..Self::StaticFactor.entry() };
            }
            Self::Layer(_, L::Density) => return Entry { path: "target.layer.*.density", ..Self::Density.entry() },
            Self::Layer(_, L::Viscosity) => {
                ("target.layer.*.viscosity", "viscosity r", Some(Viscosity), NotNegative, Is(0.0))
            }
            Self::Stage(_, S::StaticForce) => ("stage.*.static_force", "static force p", Some(Force), Finite, Is(0.0)),
            Self::Stage(_, S::Stiffness) => ("stage.*.stiffness", "stiffness s", Some(Stiffness), NotNegative, Is(0.0)),
            Self::Stage(_, S::Viscosity) => ("stage.*.viscosity", "viscosity r", Some(Viscosity), NotNegative, Is(0.0)),
            Self::Stage(_, S::Drag) => ("stage.*.drag", "drag q", Some(Drag), NotNegative, Is(0.0)),
            Self::Stage(_, S::End) => ("stage.*.end", "end x", Some(Length), NotNegative, Is(f64::INFINITY)),
            Self::Stage(_, S::EndVelocity) => {
                ("stage.*.end_velocity", "end velocity", Some(Velocity), Positive, Means("no end at a velocity"))
            }
            Self::Stage(_, S::AddMass) => {
                ("stage.*.add_mass", "added mass", Some(Mass), NotNegative, Means("no mass joins"))
            }
            Self::Own(_) => ("parameters.*", "parameter", None, Finite, Refused("\"1 N\"")),
            Self::ThicknessRatio => ("H/d", "thickness ratio H/d", None, NotNegative, GROUP),
            Self::Geometry => ("N", "geometry function N", None, Positive, GROUP),
            Self::Impact => ("I", "impact function I", None, NotNegative, GROUP),
        };
        Entry { path, name, dimension, range, absence }
    }

    /// Last word of its path, the key in a scene file.
    pub fn key(self) -> &'static str {
        if let Self::Own(name) = self {
            return name.text();
        }
        let path = self.entry().path;
        path.rsplit('.').next().unwrap_or(path)
    }

    /// Column in a table of scenes: the path without its first word, and the SI unit, as in `crater_stiffness_n_m`.
    pub fn column(self) -> String {
        let Entry { path, dimension, .. } = self.entry();
        let name = path.split_once('.').map_or(path, |(_, rest)| rest).replace('.', "_");
        let unit = dimension.map_or(String::new(), |dimension| format!("_{}", dimension.units()[0]));
        name + &unit.to_lowercase().replace('/', "_").replace('^', "")
    }

    /// Name, symbol and unit for messages: `the mass M (kg)`.
    pub fn label(self) -> String {
        let Entry { name, dimension, .. } = self.entry();
        let whose = match self {
            Self::Layer(..) => "a layer's",
            Self::Stage(..) => "a stage's",
            _ => "the",
        };
        let unit = dimension.map_or(String::new(), |dimension| format!(" [{}]", dimension.symbol()));
        format!("{whose} {name}{unit}")
    }

    /// Refuses a `value` outside the range of the number.
    ///
    /// # Errors
    /// [`ResolveError::Inadmissible`].
    #[inline]
    pub fn admit(self, value: f64) -> Resolved<()> {
        if self.entry().range.contains(value) {
            Ok(())
        } else {
            Err(ResolveError::Inadmissible { parameter: self, value })
        }
    }

    /// The number whose value this one sets: that of a group, and itself for any other.
    #[must_use]
    pub fn moves(self) -> Self {
        match self {
            Self::ThicknessRatio => Self::Thickness,
            Self::Geometry => Self::Density,
            Self::Impact => Self::Velocity,
            plain => plain,
        }
    }

    /// SI value of `text`, "20 MPa" or a bare number.
    ///
    /// # Errors
    /// [`ParameterError::Value`].
    pub fn parse_value(self, text: &str) -> Result<f64, ParameterError> {
        let text = text.trim();
        // The one number with a unit that is no dimension.
        let text =
            if self == Self::HalfAngle { text.trim_end_matches("deg").trim_end_matches('°').trim() } else { text };
        let read = match (number(text), self.entry().dimension) {
            // A bare number is SI; anything else must have a unit of the dimension.
            (Err(QuantityError::NoNumber), Some(dimension)) => quantity(text, dimension),
            (Err(QuantityError::NoNumber), None) => Err(match split(text) {
                ("", _) => QuantityError::NoNumber,
                (_, behind) => QuantityError::Behind { text: behind.trim().to_owned() },
            }),
            (bare, _) => bare,
        };
        read.map_err(|cause| ParameterError::Value { parameter: self, text: text.to_owned(), cause })
    }

    /// The values that two texts give the number, in SI units, and the unit of both, where it is a parameter of a law and has any:
    /// [`Parameter::admit_unit`] says whether a scene has it in that.
    ///
    /// # Errors
    /// [`ParameterError::Value`]; [`ParameterError::OneUnit`] or [`ParameterError::OtherUnit`] where the two differ.
    pub fn parse_ends(self, ends: [&str; 2]) -> Result<([f64; 2], Option<Unit>), ParameterError> {
        let [from, to] = ends;
        let ((from, unit), (to, unit_of_to)) = (self.parse_value_and_unit(from)?, self.parse_value_and_unit(to)?);
        let [from_is_bare, to_is_bare] = ends.map(|text| number(text.trim()).is_ok());
        // Zero is zero in every unit.
        if from_is_bare != to_is_bare && from != 0.0 && to != 0.0 {
            let [from, to] = ends.map(str::to_owned);
            return Err(ParameterError::OneUnit { from, to });
        }
        match (unit, unit_of_to) {
            (Some(right), Some(unit)) if unit != right => {
                Err(ParameterError::OtherUnit { parameter: self, unit, right })
            }
            _ => Ok(([from, to], unit.or(unit_of_to))),
        }
    }

    /// As [`Parameter::parse_value`], with the unit that `text` gives a parameter of a law.
    fn parse_value_and_unit(self, text: &str) -> Result<(f64, Option<Unit>), ParameterError> {
        let text = text.trim();
        if !matches!(self, Self::Own(_)) || number(text).is_ok() {
            return Ok((self.parse_value(text)?, None));
        }
        let error = |cause| ParameterError::Value { parameter: self, text: text.to_owned(), cause };
        let (quantity, powers) = Quantity::with_any_unit(text).map_err(error)?;
        // Of too high a power.
        let unknown = || error(QuantityError::UnknownUnit { unit: text.to_owned() });
        Ok((quantity.value, Some(Unit::of(&powers).ok_or_else(unknown)?)))
    }

    /// Whether `unit` is the one that `scene` has for the number; no unit is that of a bare number, in SI.
    ///
    /// # Errors
    /// [`ParameterError::OtherUnit`].
    pub fn admit_unit(self, scene: &Scene, unit: Option<Unit>) -> Result<(), ParameterError> {
        let own = scene.parameters.iter().find(|one| Self::Own(one.name) == self);
        match (own, unit) {
            (Some(OwnParameter { unit: right, .. }), Some(unit)) if unit != *right => {
                Err(ParameterError::OtherUnit { parameter: self, unit, right: *right })
            }
            _ => Ok(()),
        }
    }

    /// Every number that `scene` gives, groups left out, in the order of the type.
    pub fn all_of(scene: &Scene) -> Vec<Self> {
        let plain = Self::PLAIN.into_iter().filter(|parameter| parameter.moves() == *parameter);
        let listed = match &scene.resistance {
            Concrete(concrete) => (0..concrete.layers.len())
                .flat_map(|index| LayerNumber::ALL.map(|which| Self::Layer(index, which)))
                .collect::<Vec<_>>(),
            Stages(stages) => {
                (0..stages.len()).flat_map(|index| StageNumber::ALL.map(|which| Self::Stage(index, which))).collect()
            }
        };
        let own = scene.parameters.iter().map(|parameter| Self::Own(parameter.name));
        plain.chain(listed).chain(own).filter(|parameter| parameter.get(scene).is_ok_and(f64::is_finite)).collect()
    }

    /// Why a scene of this kind cannot have the number; `None` if it has it, or leaves it out.
    fn obstacle(self, scene: &Scene) -> Option<&'static str> {
        match (self, &scene.resistance) {
            (Self::Own(name), _) => {
                let is_there = scene.parameters.iter().any(|one| one.name == name);
                (!is_there).then_some("its forces have no such parameter")
            }
            (Self::HalfAngle | Self::ShearStrength, _) => scene.plug.is_none().then_some("its criterion is not `plug`"),
            (Self::Mass | Self::Velocity, _) | (Self::Thickness, Stages(_)) => None,
            (Self::Stage(index, which), Stages(stages)) => {
                let is_table = which.is_coefficient() && scene.force_of(index).is_some();
                let is_given = scene.end_of(index).is_some_and(|end| end.number(which).is_some());
                let why = match which {
                    StageNumber::EndVelocity if !is_given => Some("that stage ends at no velocity"),
                    StageNumber::AddMass if !is_given => Some("no mass joins at the end of that stage"),
                    _ => is_table.then_some("that stage gives its force as a table"),
                };
                if index >= stages.len() { Some("it has fewer stages, counted from 0") } else { why }
            }
            (Self::Stage(..), _) => Some("it gives no stages"),
            (_, Stages(_)) => Some("it gives its stages outright"),
            (Self::Layer(index, _), Concrete(concrete)) => {
                (index >= concrete.layers.len()).then_some("it has fewer layers, counted from 0")
            }
            (
                Self::Diameter | Self::NoseFactor | Self::InertiaFactor | Self::CraterRatio | Self::CraterStiffness,
                _,
            ) => None,
            (_, Concrete(concrete)) => {
                (!concrete.layers.is_empty()).then_some("its layers have their own, such as target.layer.0.strength")
            }
        }
    }

    /// Value in `scene`.
    ///
    /// # Errors
    /// [`ParameterError::Absent`].
    pub fn get(self, scene: &Scene) -> Result<f64, ParameterError> {
        let absent = |why| ParameterError::Absent { parameter: self, why };
        if let Some(why) = self.obstacle(scene) {
            return Err(absent(why));
        }
        let velocity = || scene.velocity.ok_or(absent("it gives no impact velocity"));
        let thickness = || scene.thickness.ok_or(absent("its target is semi-infinite"));
        Ok(match (self, &scene.resistance) {
            (Self::Own(name), _) => {
                scene.parameters.iter().find(|one| one.name == name).map_or(f64::NAN, |one| one.value)
            }
            (Self::Mass, _) => scene.mass,
            (Self::Velocity, _) => velocity()?,
            (Self::HalfAngle, _) => scene.plug.map_or(f64::NAN, |plug| plug.half_angle),
            (Self::ShearStrength, _) => scene.plug.map_or(f64::NAN, |plug| plug.shear_strength),
            (Self::Stage(index, which), Stages(stages)) => {
                let number = scene.end_of(index).and_then(|end| end.number(which));
                number.unwrap_or_else(|| which.of(stages[index]))
            }
            // No other number gets past its obstacle.
            (Self::Thickness | Self::Stage(..), _) | (_, Stages(_)) => thickness()?,
            (Self::Diameter, Concrete(concrete)) => concrete.diameter,
            (Self::NoseFactor, Concrete(concrete)) => concrete.nose_factor,
            (Self::Strength, Concrete(concrete)) => concrete.strength,
            (Self::Density, Concrete(concrete)) => concrete.density,
            (Self::StaticFactor, Concrete(concrete)) => concrete.static_factor,
            (Self::InertiaFactor, Concrete(concrete)) => concrete.inertia_factor,
            (Self::CraterRatio, Concrete(concrete)) => concrete.crater_ratio,
            (Self::CraterStiffness, Concrete(concrete)) => match concrete.crater_stiffness {
                CraterStiffness::Given(stiffness) => stiffness,
                CraterStiffness::Continuous => return Err(absent("its c follows from the continuous force")),
            },
            (Self::Layer(index, which), Concrete(concrete)) => which.of(concrete.layers[index]),
            (Self::ThicknessRatio, Concrete(concrete)) => thickness()? / concrete.diameter,
            (Self::Geometry, _) => groups::Groups::of(scene, 1.0)
                .and_then(|groups| groups.geometry)
                .ok_or(absent("it has no drag, and N is infinite"))?,
            (Self::Impact, _) => groups::Groups::of(scene, velocity()?).map_or(f64::NAN, |groups| groups.impact),
        })
    }

    /// Sets the value in `scene`, S with the strength where S follows Eq. 14, H with a layer's thickness.
    ///
    /// Does not check the value: [`Scene::resolve`] does. A thickness and a velocity may be set where the scene gives
    /// none, and so may a crater constant.
    ///
    /// # Errors
    /// [`ParameterError::Absent`].
    pub fn set(self, scene: &mut Scene, value: f64) -> Result<(), ParameterError> {
        if let Some(why) = self.obstacle(scene) {
            return Err(ParameterError::Absent { parameter: self, why });
        }
        let (mass, follows_eq14) = (scene.mass, self.moves_static_factor(scene));
        match (self, &mut scene.resistance) {
            (Self::Own(name), _) => {
                scene.parameters.iter_mut().filter(|one| one.name == name).for_each(|one| one.value = value);
            }
            (Self::Mass, _) => scene.mass = value,
            (Self::Velocity, _) => scene.velocity = Some(value),
            (Self::HalfAngle, _) => scene.plug.iter_mut().for_each(|plug| plug.half_angle = value),
            (Self::ShearStrength, _) => scene.plug.iter_mut().for_each(|plug| plug.shear_strength = value),
            (Self::Stage(index, which), Stages(stages)) => {
                let end = scene.ends.iter_mut().find(|(stage, _)| *stage == index);
                if let Some(number) = end.and_then(|(_, end)| end.number_mut(which)) {
                    *number = value;
                } else if let Some(number) = which.field(&mut stages[index]) {
                    *number = value;
                }
            }
            // No other number gets past its obstacle.
            (Self::Thickness | Self::Stage(..), _) | (_, Stages(_)) => scene.thickness = Some(value),
            (Self::Diameter, Concrete(concrete)) => concrete.diameter = value,
            (Self::NoseFactor, Concrete(concrete)) => concrete.nose_factor = value,
            (Self::Strength, Concrete(concrete)) => {
                concrete.strength = value;
                if follows_eq14 {
                    concrete.static_factor = semi_empirical::static_factor(value);
                }
            }
            (Self::Density, Concrete(concrete)) => concrete.density = value,
            (Self::StaticFactor, Concrete(concrete)) => {
                (concrete.static_factor, concrete.follows_eq14) = (value, false);
            }
            (Self::InertiaFactor, Concrete(concrete)) => concrete.inertia_factor = value,
            (Self::CraterRatio, Concrete(concrete)) => concrete.crater_ratio = value,
            (Self::CraterStiffness, Concrete(concrete)) => concrete.crater_stiffness = CraterStiffness::Given(value),
            (Self::Layer(index, which), Concrete(concrete)) => {
                let layer = &mut concrete.layers[index];
                *which.field(layer) = value;
                if follows_eq14 {
                    layer.static_factor = semi_empirical::static_factor_or_none(value);
                }
                layer.follows_eq14 &= which != LayerNumber::StaticFactor;
                let sum = concrete.layers.iter().fold(0.0, |sum, layer| sum + layer.thickness);
                scene.thickness = sum.is_finite().then_some(sum);
            }
            (Self::ThicknessRatio, Concrete(concrete)) => scene.thickness = Some(value * concrete.diameter),
            (Self::Geometry, Concrete(concrete)) => concrete.density = groups::density_for(value, mass, concrete),
            (Self::Impact, Concrete(concrete)) => {
                scene.velocity = Some(groups::impact_speed_for(value, mass, concrete));
            }
        }
        Ok(())
    }

    /// True if setting it in `scene` changes an S that follows Eq. 14, because none is stated.
    pub fn moves_static_factor(self, scene: &Scene) -> bool {
        let Some(concrete) = scene.concrete() else { return false };
        match self {
            Self::Strength => concrete.layers.is_empty() && concrete.follows_eq14,
            Self::Layer(index, LayerNumber::Strength) => concrete.layers.get(index).is_some_and(|l| l.follows_eq14),
            _ => false,
        }
    }
}

impl Scene {
    /// Which numbers are not stated in the scene and follow others, one sentence each.
    pub fn follows(&self) -> Vec<String> {
        let Some(concrete) = self.concrete() else { return Vec::new() };
        let mut sentences = Vec::new();
        let eq14 = |of: &str| format!("{of} by Eq. 14");
        let layers = concrete.layers.iter().enumerate().filter(|(_, layer)| layer.follows_eq14);
        let layers: Vec<_> = layers.map(|(index, _)| index.to_string()).collect();
        if concrete.layers.is_empty() && concrete.follows_eq14 {
            sentences.push(eq14("resistance.S follows target.strength"));
        } else if !layers.is_empty() && layers.len() == concrete.layers.len() {
            sentences.push(eq14("target.layer.*.S follows target.layer.*.strength"));
        } else if !layers.is_empty() {
            sentences.push(eq14(&format!("S follows the strength in layer {}", layers.join(", "))));
        }
        if concrete.crater_stiffness == CraterStiffness::Continuous && concrete.crater_ratio > 0.0 {
            let words =
                "resistance.crater_stiffness follows from a force continuous at x = k d, impact.velocity included";
            sentences.push(words.to_owned());
        }
        if !concrete.layers.is_empty() && self.thickness.is_some() {
            sentences.push("target.thickness is the sum of the layers".to_owned());
        }
        sentences
    }
}

impl LayerNumber {
    /// Every number of a layer.
    pub const ALL: [Self; 5] = [Self::Thickness, Self::Strength, Self::Density, Self::StaticFactor, Self::Viscosity];

    /// Its value in `layer`.
    pub(super) fn of(self, mut layer: Layer) -> f64 {
        *self.field(&mut layer)
    }

    fn field(self, layer: &mut Layer) -> &mut f64 {
        match self {
            Self::Thickness => &mut layer.thickness,
            Self::Strength => &mut layer.strength,
            Self::Density => &mut layer.density,
            Self::StaticFactor => &mut layer.static_factor,
            Self::Viscosity => &mut layer.viscosity,
        }
    }
}

impl StageNumber {
    /// Every number of a stage.
    pub const ALL: [Self; 7] =
        [Self::StaticForce, Self::Stiffness, Self::Viscosity, Self::Drag, Self::End, Self::EndVelocity, Self::AddMass];

    /// Whether it is one of the four of `p + s x + r V + q V²`.
    pub fn is_coefficient(self) -> bool {
        !matches!(self, Self::End | Self::EndVelocity | Self::AddMass)
    }

    /// Its value in `stage`.
    pub(super) fn of(self, mut stage: Stage) -> f64 {
        self.field(&mut stage).map_or(f64::NAN, |number| *number)
    }

    /// Its place in `stage`, where the stage itself has it.
    fn field(self, stage: &mut Stage) -> Option<&mut f64> {
        Some(match self {
            Self::StaticForce => &mut stage.static_force,
            Self::Stiffness => &mut stage.stiffness,
            Self::Viscosity => &mut stage.viscosity,
            Self::Drag => &mut stage.drag,
            Self::End => &mut stage.end,
            Self::EndVelocity | Self::AddMass => return None,
        })
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.entry().path;
        match self {
            Self::Layer(index, _) | Self::Stage(index, _) => f.write_str(&path.replace('*', &index.to_string())),
            Self::Own(name) => f.write_str(&path.replace('*', name.text())),
            _ => f.write_str(path),
        }
    }
}

impl FromStr for Parameter {
    type Err = ParameterError;

    fn from_str(path: &str) -> Result<Self, ParameterError> {
        if let Some(name) = path.strip_prefix("parameters.").and_then(Name::new) {
            return Ok(Self::Own(name));
        }
        let index = path.split('.').find_map(|word| word.parse().ok()).unwrap_or(0);
        let words = path.split('.').map(|word| word.parse::<usize>().map_or(word, |_| "*"));
        let general = words.collect::<Vec<_>>().join(".");
        let listed = LayerNumber::ALL.map(|which| Self::Layer(index, which)).into_iter();
        let mut all = listed.chain(StageNumber::ALL.map(|which| Self::Stage(index, which))).chain(Self::PLAIN);
        all.find(|parameter| parameter.entry().path == general).ok_or_else(|| ParameterError::Unknown(path.to_owned()))
    }
}

/// Why a number of a scene cannot be named or set. All are mistakes of the caller, exit code 2.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// No number of any scene has this path.
    #[error("`{0}` names no number of a scene")]
    Unknown(String),
    /// This scene does not have the number.
    #[error("the scene has no `{parameter}`: {why}")]
    Absent {
        /// The number.
        parameter: Parameter,
        /// Why not.
        why: &'static str,
    },
    /// A value that cannot be read.
    #[error("`{text}` is no value of `{parameter}`: {cause}")]
    Value {
        /// The number.
        parameter: Parameter,
        /// The text.
        text: String,
        /// What is wrong with it.
        cause: QuantityError,
    },
    /// One end with a unit and one without: a bare number is SI, which is hardly meant.
    #[error("`{from}:{to}` has one unit and needs two")]
    OneUnit {
        /// Text of the first value.
        from: String,
        /// Text of the last value.
        to: String,
    },
    /// A parameter of a law in another unit than the scene has it in, or the other end.
    #[error("`{parameter}` is in {right}, and {unit} is given")]
    OtherUnit {
        /// The parameter.
        parameter: Parameter,
        /// The unit written.
        unit: Unit,
        /// That of the scene.
        right: Unit,
    },
    /// A text that is no spread.
    #[error("`{0}` is not of the form PATH=REL, REL from 0 to 1 or in percent")]
    Spread(String),
    /// A spread of a group, which is no input.
    #[error("`{0}` is a group of inputs: give the spreads of the numbers themselves")]
    Group(Parameter),
    /// A spread of a number on which V_c does not depend.
    #[error("V_c does not depend on `{0}`")]
    NoInput(Parameter),
    /// Two spreads of a number.
    #[error("`{0}` has two spreads")]
    Twice(Parameter),
}

impl Advice for ParameterError {
    fn help(&self) -> String {
        match self {
            Self::Unknown(_) => {
                let names = Parameter::PLAIN.map(|parameter| parameter.entry().path).join(", ");
                format!("choose from {names}, target.layer.0.strength and its like, stage.0.drag and its like")
            }
            Self::Absent { .. } => "vary a number that the scene file gives".to_owned(),
            Self::Value { parameter, .. } => match parameter.entry().dimension {
                Some(dimension) => format!("write {} with its unit, or a bare SI number", dimension.noun()),
                None if matches!(parameter, Parameter::Own(_)) => {
                    "write it with its unit, such as 300MPa, or as a bare SI number".to_owned()
                }
                None => "write a plain number".to_owned(),
            },
            Self::OneUnit { .. } => "give both ends a unit, or neither for SI".to_owned(),
            Self::OtherUnit { right, .. } => format!("write it in a unit of {right}, or as a bare SI number"),
            Self::Spread(_) | Self::Group(_) => {
                "write for example --spread target.strength=5%, or 5%:normal, 5%:uniform".to_owned()
            }
            Self::NoInput(_) => "leave its spread out: V_c is sought whatever the impact velocity".to_owned(),
            Self::Twice(_) => "leave one of the two out".to_owned(),
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::exchange::scene_file::SHIPPED;
    use crate::physics::groups::Groups;
    use crate::testing::shipped;

    #[test]
    fn every_path_reads_back_as_itself_and_every_number_set_is_the_number_got() {
        for (name, _) in SHIPPED {
            let scene = shipped(name);
            for parameter in Parameter::all_of(&scene) {
                assert_eq!(parameter.to_string().parse(), Ok(parameter));
                let mut moved = scene.clone();
                let value = parameter.get(&scene).unwrap() * 1.25;
                parameter.set(&mut moved, value).unwrap();
                assert_eq!(parameter.get(&moved), Ok(value), "{parameter} of {name}");
                if value != 0.0 {
                    assert_ne!(scene, moved, "{parameter} of {name}");
                }
            }
        }
    }

    #[test]
    fn the_numbers_of_a_scene_are_those_of_each_layer_and_each_stage_from_the_first() {
        let of = |name: &str| Parameter::all_of(&shipped(name)).iter().map(ToString::to_string).collect::<Vec<_>>();
        for (name, path) in
            [("layered", "target.layer.0.thickness"), ("layered", "target.layer.2.S"), ("viscous", "stage.0.viscosity")]
        {
            assert!(of(name).iter().any(|one| one == path), "{path}: {:?}", of(name));
        }
        let error = Parameter::Stage(0, StageNumber::EndVelocity).get(&shipped("viscous")).unwrap_err().to_string();
        assert!(error.contains("ends at no velocity"), "{error}");
        let error = Parameter::Stage(0, StageNumber::AddMass).get(&shipped("viscous")).unwrap_err().to_string();
        assert!(error.contains("no mass joins"), "{error}");
    }

    #[test]
    fn columns_of_a_table_are_the_paths_of_a_plain_target_with_their_units() {
        let columns: Vec<_> = Parameter::PLAIN[..11].iter().map(|parameter| parameter.column()).collect();
        assert_eq!(columns.join(",") + ",criterion,nose,CRH,tip_ratio,R_pa", crate::studies::batch::SCENES.header());
    }

    #[test]
    fn a_number_is_labelled_with_symbol_and_unit_and_its_example_lies_in_its_range() {
        assert_eq!(Parameter::Density.label(), "the density rho [kg/m³]");
        assert_eq!(Parameter::Layer(0, LayerNumber::StaticFactor).label(), "a layer's static factor S");
        assert_eq!(Parameter::Stage(3, StageNumber::Drag).label(), "a stage's drag q [kg/m]");
        for parameter in Parameter::PLAIN {
            match parameter.entry().absence {
                Absence::Refused(example) => {
                    let value = example.split('"').nth(1).unwrap_or(example);
                    assert_eq!(parameter.admit(parameter.parse_value(value).unwrap()), Ok(()), "{parameter}");
                }
                Absence::Is(default) => assert_eq!(parameter.admit(default), Ok(())),
                Absence::Means(text) => assert!(!text.is_empty()),
            }
        }
        let listed = [shipped("layered"), shipped("stiff")].into_iter().flat_map(|scene| Parameter::all_of(&scene));
        let numbers: Vec<_> =
            Parameter::PLAIN.into_iter().chain(listed.filter(|p| p.to_string().contains(".0."))).collect();
        let of =
            |range| numbers.iter().filter(|p| p.entry().range == range).map(ToString::to_string).collect::<Vec<_>>();
        let positive = ["projectile.mass", "projectile.diameter", "target.strength", "resistance.S"];
        assert_eq!(
            of(Range::Positive),
            [&positive[..], &["resistance.crater_stiffness", "perforation.shear_strength", "N"]].concat()
        );
        assert_eq!(of(Range::UnitInterval), ["projectile.nose.factor"]);
        assert_eq!(of(Range::Finite), ["stage.0.static_force"]);
        assert_eq!(of(Range::NotNegative).len(), numbers.len() - 10);
    }

    #[test]
    fn groups_move_the_one_number_that_they_say() {
        let mut scene = shipped("paper-slab");
        for (parameter, value) in
            [(Parameter::ThicknessRatio, 7.0), (Parameter::Geometry, 12.5), (Parameter::Impact, 3.0)]
        {
            parameter.set(&mut scene, value).unwrap();
            assert!((parameter.get(&scene).unwrap() / value - 1.0).abs() < 1e-15, "{parameter}");
        }
        let groups = Groups::of(&scene, scene.velocity.unwrap()).unwrap();
        assert!((groups.impact / 3.0 - 1.0).abs() < 1e-15, "{groups:?}");
        assert_eq!(Parameter::Impact.moves(), Parameter::Velocity);
    }

    #[test]
    fn static_factor_follows_the_strength_where_it_follows_eq_14_and_else_stays() {
        let mut slab = shipped("paper-slab");
        assert!(Parameter::Strength.moves_static_factor(&slab));
        Parameter::Strength.set(&mut slab, 64e6).unwrap();
        assert_eq!(Parameter::StaticFactor.get(&slab), Ok(9.0));
        Parameter::StaticFactor.set(&mut slab, 10.0).unwrap();
        Parameter::Strength.set(&mut slab, 36e6).unwrap();
        assert_eq!(Parameter::StaticFactor.get(&slab), Ok(10.0));
        let mut layers = shipped("layered");
        for (strength, factor) in [(64e6, 9.0), (36e6, 12.0)] {
            Parameter::Layer(1, LayerNumber::Strength).set(&mut layers, strength).unwrap();
            assert_eq!(Parameter::Layer(1, LayerNumber::StaticFactor).get(&layers), Ok(factor));
        }
        assert!(!Parameter::Strength.moves_static_factor(&shipped("viscous")));
        // Stated, and as Eq. 14 would have it.
        let mut tunnel = shipped("tunnel");
        Parameter::Strength.set(&mut tunnel, 64e6).unwrap();
        assert_eq!(Parameter::StaticFactor.get(&tunnel), Ok(12.0));
        Parameter::Layer(1, LayerNumber::StaticFactor).set(&mut layers, 12.0).unwrap();
        Parameter::Layer(1, LayerNumber::Strength).set(&mut layers, 64e6).unwrap();
        assert_eq!(Parameter::Layer(1, LayerNumber::StaticFactor).get(&layers), Ok(12.0));
    }

    #[test]
    fn a_scene_says_which_of_its_numbers_follow_others() {
        let said = |name: &str| shipped(name).follows().join("; ");
        assert!(
            said("paper-slab")
                .starts_with("resistance.S follows target.strength by Eq. 14; resistance.crater_stiffness")
        );
        assert!(said("tunnel").starts_with("resistance.crater_stiffness follows"), "{}", said("tunnel"));
        assert_eq!(said("jump"), "");
        assert!(said("layered").starts_with("target.layer.*.S follows") && said("layered").ends_with("the layers"));
        assert_eq!(said("viscous"), "");
        // Of a slab of one medium, and of layers of which one has a stated S.
        assert!(!said("paper-slab").contains("sum of the layers"), "{}", said("paper-slab"));
        let mut layers = shipped("layered");
        Parameter::Layer(1, LayerNumber::StaticFactor).set(&mut layers, 12.0).unwrap();
        assert!(layers.follows()[0].starts_with("S follows the strength in layer 0, 2 by"), "{:?}", layers.follows());
        let mut tunnel = shipped("tunnel");
        for (ratio, has_crater) in [(0.0, false), (0.5, true)] {
            Parameter::CraterRatio.set(&mut tunnel, ratio).unwrap();
            assert_eq!(!tunnel.follows().is_empty(), has_crater, "k = {ratio}");
        }
    }

    #[test]
    fn a_layer_that_grows_takes_the_target_with_it() {
        let mut scene = shipped("layered");
        Parameter::Layer(2, LayerNumber::Thickness).set(&mut scene, 0.3).unwrap();
        assert!(scene.problem().is_ok());
        assert_eq!(scene.thickness, Some(0.12 + 0.08 + 0.3));
    }

    #[test]
    fn values_take_units_of_their_dimension_or_none() {
        assert_eq!(Parameter::Strength.parse_value("20MPa"), Ok(20e6));
        assert_eq!(Parameter::Strength.parse_value("2e7"), Ok(2e7));
        assert_eq!(Parameter::ThicknessRatio.parse_value("0.5"), Ok(0.5));
        for (parameter, text) in [
            (Parameter::Strength, "20 mm"),
            (Parameter::ThicknessRatio, "5 m"),
            (Parameter::Mass, "nan"),
            (Parameter::Mass, ""),
        ] {
            assert!(matches!(parameter.parse_value(text), Err(ParameterError::Value { .. })), "{text}");
        }
        let behind = Parameter::ThicknessRatio.parse_value("2 m").unwrap_err().to_string();
        assert_eq!(behind, "`2 m` is no value of `H/d`: it has no unit, and `m` stands behind the number");
    }

    #[test]
    fn numbers_that_a_scene_lacks_are_refused_with_the_reason() {
        let absent = |path: &str, scene: &str| {
            let parameter: Parameter = path.parse().unwrap();
            let mut scene = shipped(scene);
            assert!(matches!(parameter.get(&scene), Err(ParameterError::Absent { .. })), "{path}");
            parameter.set(&mut scene, 1.0).unwrap_err().to_string()
        };
        assert!(absent("target.strength", "layered").contains("target.layer.0.strength"));
        assert!(absent("H/d", "viscous").contains("stages outright"));
        assert!(absent("stage.1.drag", "viscous").contains("fewer stages"));
        assert!(absent("target.layer.3.strength", "layered").contains("fewer layers"));
        assert!("target.colour".parse::<Parameter>().unwrap_err().help().contains("projectile.mass"));
        assert!("target.layer.x.strength".parse::<Parameter>().is_err());
    }
}
