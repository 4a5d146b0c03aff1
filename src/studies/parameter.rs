//! The numbers of a scene by name: what a sweep varies, a spread blurs, and a sensitivity differentiates.
//!
//! A path such as `target.strength` names the number as the scene file does. Three groups (theory section 1) are paths
//! too, each with the one number that it moves: `H/d` the thickness, `I` the impact velocity, `N` the density.
//!
//! Where a scene leaves S to Eq. 14, S follows the strength: `target.strength` then stands for both.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::physics::units::{Dimension, QuantityError, number, quantity};
use crate::physics::{Concrete, CraterStiffness, Resistance, Scene, groups, semi_empirical};

/// A number of a scene, or a group of them.
///
/// The order is the one in which several are set: S after the strength that it may follow, groups after the numbers
/// they are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Parameter {
    /// Projectile mass M [kg].
    Mass,
    /// Projectile diameter d [m].
    Diameter,
    /// Nose factor N*.
    NoseFactor,
    /// Unconfined compressive strength fc [Pa].
    Strength,
    /// Target density rho [kg/m³].
    Density,
    /// Target thickness H [m].
    Thickness,
    /// Static strength over fc, S.
    StaticFactor,
    /// Inertia factor B.
    InertiaFactor,
    /// Crater depth in diameters, k.
    CraterRatio,
    /// Crater constant c [N/m], where it is given.
    CraterStiffness,
    /// Impact velocity V0 [m/s].
    Velocity,
    /// A number of the layer `.0`, counted from 0.
    Layer(usize, LayerNumber),
    /// A number of the stage `.0`, counted from 0.
    Stage(usize, StageNumber),
    /// H/d, which moves the thickness.
    ThicknessRatio,
    /// Geometry function N, which moves the density.
    Geometry,
    /// Impact function I, which moves the impact velocity.
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
}

/// Numbers with a path of one name.
const NAMES: [(Parameter, &str); 14] = [
    (Parameter::Mass, "projectile.mass"),
    (Parameter::Diameter, "projectile.diameter"),
    (Parameter::NoseFactor, "projectile.nose.factor"),
    (Parameter::Strength, "target.strength"),
    (Parameter::Density, "target.density"),
    (Parameter::Thickness, "target.thickness"),
    (Parameter::StaticFactor, "resistance.S"),
    (Parameter::InertiaFactor, "resistance.B"),
    (Parameter::CraterRatio, "resistance.k"),
    (Parameter::CraterStiffness, "resistance.crater_stiffness"),
    (Parameter::Velocity, "impact.velocity"),
    (Parameter::ThicknessRatio, "H/d"),
    (Parameter::Geometry, "N"),
    (Parameter::Impact, "I"),
];

const LAYER_NAMES: [(LayerNumber, &str); 5] = [
    (LayerNumber::Thickness, "thickness"),
    (LayerNumber::Strength, "strength"),
    (LayerNumber::Density, "density"),
    (LayerNumber::StaticFactor, "S"),
    (LayerNumber::Viscosity, "viscosity"),
];

const STAGE_NAMES: [(StageNumber, &str); 5] = [
    (StageNumber::StaticForce, "static_force"),
    (StageNumber::Stiffness, "stiffness"),
    (StageNumber::Viscosity, "viscosity"),
    (StageNumber::Drag, "drag"),
    (StageNumber::End, "end"),
];

/// Why a number of a scene cannot be named or set. All are mistakes of the caller, exit code 2.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// No number of any scene is called so.
    #[error("`{path}` names no number of a scene")]
    Unknown {
        /// The text.
        path: String,
    },
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
}

impl ParameterError {
    /// Help for a person: what to write.
    pub fn help(&self) -> String {
        match self {
            Self::Unknown { .. } => {
                let names: Vec<_> = NAMES.iter().map(|(_, name)| *name).collect();
                format!(
                    "choose from {}, target.layer.0.strength and its like, stage.0.drag and its like",
                    names.join(", ")
                )
            }
            Self::Absent { .. } => "vary a number that the scene file gives".to_owned(),
            Self::Value { parameter, .. } => match parameter.dimension() {
                Some(dimension) => format!("write {} with its unit, or a bare SI number", dimension.noun()),
                None => "write a plain number".to_owned(),
            },
        }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Layer(index, which) => {
                let name = LAYER_NAMES.iter().find(|(w, _)| w == which).map_or("", |(_, name)| name);
                write!(f, "target.layer.{index}.{name}")
            }
            Self::Stage(index, which) => {
                let name = STAGE_NAMES.iter().find(|(w, _)| w == which).map_or("", |(_, name)| name);
                write!(f, "stage.{index}.{name}")
            }
            plain => f.write_str(NAMES.iter().find(|(p, _)| p == plain).map_or("", |(_, name)| name)),
        }
    }
}

impl FromStr for Parameter {
    type Err = ParameterError;

    fn from_str(path: &str) -> Result<Self, ParameterError> {
        let unknown = || ParameterError::Unknown { path: path.to_owned() };
        if let Some((parameter, _)) = NAMES.iter().find(|(_, name)| *name == path) {
            return Ok(*parameter);
        }
        let of_list = |rest: &str| {
            let (index, name) = rest.split_once('.')?;
            Some((index.parse::<usize>().ok()?, name.to_owned()))
        };
        if let Some((index, name)) = path.strip_prefix("target.layer.").and_then(of_list) {
            let which = LAYER_NAMES.iter().find(|(_, n)| *n == name).ok_or_else(unknown)?.0;
            return Ok(Self::Layer(index, which));
        }
        if let Some((index, name)) = path.strip_prefix("stage.").and_then(of_list) {
            let which = STAGE_NAMES.iter().find(|(_, n)| *n == name).ok_or_else(unknown)?.0;
            return Ok(Self::Stage(index, which));
        }
        Err(unknown())
    }
}

impl Parameter {
    /// Dimension of its values; `None` for a plain number.
    pub fn dimension(self) -> Option<Dimension> {
        match self {
            Self::Mass => Some(Dimension::Mass),
            Self::Diameter
            | Self::Thickness
            | Self::Layer(_, LayerNumber::Thickness)
            | Self::Stage(_, StageNumber::End) => Some(Dimension::Length),
            Self::Strength | Self::Layer(_, LayerNumber::Strength) => Some(Dimension::Pressure),
            Self::Density | Self::Layer(_, LayerNumber::Density) => Some(Dimension::Density),
            Self::CraterStiffness | Self::Stage(_, StageNumber::Stiffness) => Some(Dimension::Stiffness),
            Self::Velocity => Some(Dimension::Velocity),
            Self::Layer(_, LayerNumber::Viscosity) | Self::Stage(_, StageNumber::Viscosity) => {
                Some(Dimension::Viscosity)
            }
            Self::Stage(_, StageNumber::StaticForce) => Some(Dimension::Force),
            Self::Stage(_, StageNumber::Drag) => Some(Dimension::Drag),
            Self::NoseFactor
            | Self::StaticFactor
            | Self::InertiaFactor
            | Self::CraterRatio
            | Self::Layer(_, LayerNumber::StaticFactor)
            | Self::ThicknessRatio
            | Self::Geometry
            | Self::Impact => None,
        }
    }

    /// The number whose value this one sets: a group and what it moves are the same.
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
        let read = match self.dimension() {
            // A bare number is SI; anything else must have a unit of the dimension.
            Some(dimension) => match number(text) {
                Err(QuantityError::NoNumber) => quantity(text, dimension),
                other => other,
            },
            None => number(text),
        };
        read.map_err(|cause| ParameterError::Value { parameter: self, text: text.to_owned(), cause })
    }

    /// Every number that `scene` gives, groups left out, in the order of the type.
    pub fn all_of(scene: &Scene) -> Vec<Self> {
        let mut all: Vec<Self> = NAMES[..11].iter().map(|(parameter, _)| *parameter).collect();
        match &scene.resistance {
            Resistance::Concrete(concrete) => {
                for index in 0..concrete.layers.len() {
                    all.extend(LAYER_NAMES.iter().map(|(which, _)| Self::Layer(index, *which)));
                }
            }
            Resistance::Stages(stages) => {
                for index in 0..stages.len() {
                    all.extend(STAGE_NAMES.iter().map(|(which, _)| Self::Stage(index, *which)));
                }
            }
        }
        all.retain(|parameter| parameter.get(scene).is_ok_and(f64::is_finite));
        all
    }

    /// Value in `scene`.
    ///
    /// # Errors
    /// [`ParameterError::Absent`].
    pub fn get(self, scene: &Scene) -> Result<f64, ParameterError> {
        let absent = |why| ParameterError::Absent { parameter: self, why };
        let velocity = || scene.velocity.ok_or(absent("it gives no impact velocity"));
        let thickness = || scene.thickness.ok_or(absent("its target is semi-infinite"));
        match self {
            Self::Mass => return Ok(scene.mass),
            Self::Velocity => return velocity(),
            Self::Stage(index, which) => {
                let Resistance::Stages(stages) = &scene.resistance else { return Err(absent("it gives no stages")) };
                let stage = stages.get(index).ok_or(absent("it has fewer stages, counted from 0"))?;
                return Ok(match which {
                    StageNumber::StaticForce => stage.static_force,
                    StageNumber::Stiffness => stage.stiffness,
                    StageNumber::Viscosity => stage.viscosity,
                    StageNumber::Drag => stage.drag,
                    StageNumber::End => stage.end,
                });
            }
            Self::Thickness if scene.concrete().is_none() => return thickness(),
            _ => {}
        }
        let concrete = scene.concrete().ok_or(absent("it gives its stages outright"))?;
        if let Self::Layer(index, which) = self {
            let layer = concrete.layers.get(index).ok_or(absent("it has fewer layers, counted from 0"))?;
            return Ok(match which {
                LayerNumber::Thickness => layer.thickness,
                LayerNumber::Strength => layer.strength,
                LayerNumber::Density => layer.density,
                LayerNumber::StaticFactor => layer.static_factor,
                LayerNumber::Viscosity => layer.viscosity,
            });
        }
        let of_one_medium = !matches!(
            self,
            Self::Diameter | Self::NoseFactor | Self::InertiaFactor | Self::CraterRatio | Self::CraterStiffness
        );
        if of_one_medium && !concrete.layers.is_empty() {
            return Err(absent("its layers have their own, such as target.layer.0.strength"));
        }
        Ok(match self {
            Self::Diameter => concrete.diameter,
            Self::NoseFactor => concrete.nose_factor,
            Self::Strength => concrete.strength,
            Self::Density => concrete.density,
            Self::StaticFactor => concrete.static_factor,
            Self::InertiaFactor => concrete.inertia_factor,
            Self::CraterRatio => concrete.crater_ratio,
            Self::CraterStiffness => match concrete.crater_stiffness {
                CraterStiffness::Given(stiffness) => stiffness,
                CraterStiffness::Continuous => return Err(absent("its c follows from the continuous force")),
            },
            Self::ThicknessRatio => thickness()? / concrete.diameter,
            Self::Geometry => groups::Groups::of(scene, 1.0)
                .and_then(|groups| groups.geometry)
                .ok_or(absent("it has no drag, and N is infinite"))?,
            Self::Impact => groups::Groups::of(scene, velocity()?).map_or(f64::NAN, |groups| groups.impact),
            _ => thickness()?,
        })
    }

    /// Sets the value in `scene`, S with the strength where S follows Eq. 14, H with a layer's thickness.
    ///
    /// Whether the value is admissible is for [`Scene::resolve`] to say. A thickness and a velocity may be set where
    /// the scene gives none, and so may a crater constant.
    ///
    /// # Errors
    /// [`ParameterError::Absent`].
    pub fn set(self, scene: &mut Scene, value: f64) -> Result<(), ParameterError> {
        // What may be absent and set all the same has the conditions of a neighbour that is always there.
        let condition = match self {
            Self::Velocity => Self::Mass,
            Self::Thickness if scene.concrete().is_none() => Self::Mass,
            Self::CraterStiffness => Self::Diameter,
            Self::Thickness | Self::ThicknessRatio | Self::Impact | Self::Geometry => Self::Strength,
            plain => plain,
        };
        condition.get(scene).map_err(|error| match error {
            ParameterError::Absent { why, .. } => ParameterError::Absent { parameter: self, why },
            other => other,
        })?;
        match self {
            Self::Mass => scene.mass = value,
            Self::Velocity => scene.velocity = Some(value),
            Self::Thickness => scene.thickness = Some(value),
            _ => {}
        }
        let mass = scene.mass;
        let concrete = match &mut scene.resistance {
            Resistance::Concrete(concrete) => concrete,
            Resistance::Stages(stages) => {
                if let Self::Stage(index, which) = self {
                    let stage = &mut stages[index];
                    *match which {
                        StageNumber::StaticForce => &mut stage.static_force,
                        StageNumber::Stiffness => &mut stage.stiffness,
                        StageNumber::Viscosity => &mut stage.viscosity,
                        StageNumber::Drag => &mut stage.drag,
                        StageNumber::End => &mut stage.end,
                    } = value;
                }
                return Ok(());
            }
        };
        match self {
            Self::Diameter => concrete.diameter = value,
            Self::NoseFactor => concrete.nose_factor = value,
            Self::Strength => {
                let follows = concrete.follows_eq14();
                concrete.strength = value;
                if follows {
                    concrete.static_factor = semi_empirical::static_factor(value);
                }
            }
            Self::Density => concrete.density = value,
            Self::StaticFactor => concrete.static_factor = value,
            Self::InertiaFactor => concrete.inertia_factor = value,
            Self::CraterRatio => concrete.crater_ratio = value,
            Self::CraterStiffness => concrete.crater_stiffness = CraterStiffness::Given(value),
            Self::Layer(index, which) => {
                set_layer(concrete, index, which, value);
                let sum = concrete.layers.iter().fold(0.0, |sum, layer| sum + layer.thickness);
                scene.thickness = sum.is_finite().then_some(sum);
            }
            Self::ThicknessRatio => scene.thickness = Some(value * concrete.diameter),
            Self::Geometry => concrete.density = groups::density_for(value, mass, concrete),
            Self::Impact => scene.velocity = Some(groups::impact_speed_for(value, mass, concrete)),
            Self::Mass | Self::Velocity | Self::Thickness | Self::Stage(..) => {}
        }
        Ok(())
    }

    /// Whether it is the viscosity of a layer or a stage.
    pub fn is_viscosity(self) -> bool {
        matches!(self, Self::Layer(_, LayerNumber::Viscosity) | Self::Stage(_, StageNumber::Viscosity))
    }

    /// Whether setting it in `scene` moves an S that follows Eq. 14.
    pub fn moves_static_factor(self, scene: &Scene) -> bool {
        let Some(concrete) = scene.concrete() else { return false };
        match self {
            Self::Strength => concrete.layers.is_empty() && concrete.follows_eq14(),
            Self::Layer(index, LayerNumber::Strength) => {
                concrete.layers.get(index).is_some_and(|l| l.static_factor == semi_empirical::static_factor(l.strength))
            }
            _ => false,
        }
    }
}

fn set_layer(concrete: &mut Concrete, index: usize, which: LayerNumber, value: f64) {
    let layer = &mut concrete.layers[index];
    match which {
        LayerNumber::Thickness => layer.thickness = value,
        LayerNumber::Strength => {
            let follows = layer.static_factor == semi_empirical::static_factor(layer.strength);
            layer.strength = value;
            if follows {
                layer.static_factor = semi_empirical::static_factor(value);
            }
        }
        LayerNumber::Density => layer.density = value,
        LayerNumber::StaticFactor => layer.static_factor = value,
        LayerNumber::Viscosity => layer.viscosity = value,
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::physics::groups::Groups;
    use crate::physics::scene_file::SHIPPED;

    fn shipped(name: &str) -> Scene {
        Scene::from_toml(SHIPPED.iter().find(|(n, _)| *n == name).unwrap().1, name).unwrap()
    }

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
        Parameter::Layer(1, LayerNumber::Strength).set(&mut layers, 36e6).unwrap();
        assert_eq!(Parameter::Layer(1, LayerNumber::StaticFactor).get(&layers), Ok(12.0));
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
    }

    #[test]
    fn numbers_that_a_scene_lacks_are_refused_with_the_reason() {
        let absent = |path: &str, scene: &str| {
            let parameter: Parameter = path.parse().unwrap();
            parameter.set(&mut shipped(scene), 1.0).unwrap_err().to_string()
        };
        assert!(absent("target.strength", "layered").contains("target.layer.0.strength"));
        assert!(absent("H/d", "viscous").contains("stages outright"));
        assert!(absent("stage.9.drag", "viscous").contains("fewer stages"));
        assert!(absent("target.layer.3.strength", "layered").contains("fewer layers"));
        assert!("target.colour".parse::<Parameter>().unwrap_err().help().contains("projectile.mass"));
        assert!("target.layer.x.strength".parse::<Parameter>().is_err());
    }
}
