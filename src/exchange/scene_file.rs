//! Which scene a TOML file describes, and where and why a file describes none (docs/reference.md, "Scene files").
//!
//! Every refusal is a [`SceneError`]: it underlines the offending text and says what is allowed and what to do.
//! Nothing is skipped or guessed: an unknown key is refused, so a misspelt optional one cannot be silently ignored.
//! Tables, keys and types are those of the serde types below; dimension, range and default of a number are those of
//! [`Parameter::entry`].

use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;
use toml::de::DeValue;

use super::diagnostic::{
    Dialect, Fault, SceneError, decode, did_you_mean, key_span, nearest, quoted, read_text, type_at,
};
use crate::physics::nose::NoseShape;
use crate::physics::parameter::{Absence, LayerNumber, Parameter, StageNumber};
use crate::physics::scene::{Concrete, CraterStiffness, Criterion, Layer, Range, Resistance, Scene, layer_beyond};
use crate::physics::units::{self, Dimension, Quantity, QuantityError};
use crate::physics::{Stage, semi_empirical};
use crate::text::Shown;

macro_rules! shipped {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../verification/scenes/", $name, ".toml")))),*]
    };
}

/// The scenes of `verification/scenes`, by file name without its ending: the real input that the suite runs on.
pub const SHIPPED: &[(&str, &str)] = shipped![
    "forrestal-1994-shot-14",
    "paper-slab",
    "crater",
    "tunnel",
    "perforate",
    "graze",
    "stiff",
    "viscous",
    "layered",
    "air-gap",
    "tunnel-no-drag",
    "perforate-no-drag",
    "jump",
    "jump-perforate",
    "thin-slab",
    "layer-at-crater-end",
    "loaded-spring",
    "spring-and-drag",
    "overdamped",
    "constant-force",
];

impl Scene {
    /// The scene that the TOML `text` describes; `file` is its name in messages.
    ///
    /// # Errors
    /// [`SceneError`]: the text is not TOML, or not a scene.
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::Scene;
    /// let text = r#"
    ///     [projectile]
    ///     mass = "1 kg"
    ///     [[stage]]
    ///     static_force = "2 kN"
    ///     [impact]
    ///     velocity = 100
    /// "#;
    /// let problem = Scene::from_toml(text, "scene.toml")?.problem()?;
    /// assert_eq!(problem.stages[0].static_force, 2000.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str, file: &str) -> Result<Self, Box<SceneError>> {
        SceneFile::from_toml(text, file).map(|read| read.scene)
    }

    /// The scene in the file at `path`; `-` is standard input.
    ///
    /// # Errors
    /// [`SceneError`]: the file cannot be read, is larger than 1 MiB (it is then not read), is not UTF-8, or is
    /// not a scene.
    pub fn read(path: &Path) -> Result<Self, Box<SceneError>> {
        let (file, text) = read_text(path)?;
        Self::from_toml(&text, &file)
    }
}

/// A scene, and the decimals that its numbers were read from.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The scene.
    pub scene: Scene,
    /// Every number that the file gives and the scene holds, in the order read. A computation that must enclose the
    /// numbers as written, and not as rounded to `f64`, starts from these.
    pub given: Vec<(Parameter, Quantity)>,
}

impl SceneFile {
    /// As [`Scene::from_toml`], with the decimals.
    ///
    /// # Errors
    /// As [`Scene::from_toml`].
    pub fn from_toml(text: &str, file: &str) -> Result<Self, Box<SceneError>> {
        let mut reader = Reader { text, given: Vec::new() };
        let read = decode(text, &DIALECT).and_then(|tables| reader.scene(tables));
        read.map(|scene| Self { scene, given: reader.given }).map_err(|fault| fault.in_file(file, text))
    }
}

/// Place of a number. What stands there is read from the text, so that its digits stay.
type Number = Spanned<IgnoredAny>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTable {
    title: Option<String>,
    projectile: Option<Spanned<ProjectileTable>>,
    target: Option<Spanned<TargetTable>>,
    resistance: Option<Spanned<ResistanceTable>>,
    impact: Option<Spanned<ImpactTable>>,
    perforation: Option<PerforationTable>,
    stage: Option<Spanned<Vec<Spanned<StageTable>>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProjectileTable {
    mass: Option<Number>,
    diameter: Option<Number>,
    nose: Option<Spanned<NoseTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NoseTable {
    factor: Option<Number>,
    shape: Option<Spanned<String>>,
    caliber_radius_head: Option<Number>,
    length_ratio: Option<Number>,
    radius_ratio: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetTable {
    strength: Option<Number>,
    density: Option<Number>,
    thickness: Option<Number>,
    layer: Option<Spanned<Vec<Spanned<LayerTable>>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LayerTable {
    thickness: Option<Number>,
    strength: Option<Number>,
    density: Option<Number>,
    #[serde(rename = "S")]
    static_factor: Option<Number>,
    viscosity: Option<Number>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ResistanceTable {
    #[serde(rename = "S")]
    static_factor: Option<Number>,
    #[serde(rename = "B")]
    inertia_factor: Option<Number>,
    #[serde(rename = "k")]
    crater_ratio: Option<Number>,
    crater_stiffness: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImpactTable {
    velocity: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PerforationTable {
    criterion: Option<Spanned<Criterion>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StageTable {
    static_force: Option<Number>,
    stiffness: Option<Number>,
    viscosity: Option<Number>,
    drag: Option<Number>,
    end: Option<Number>,
}

/// Paths of what is no number of a scene, to tell where a misplaced key belongs.
const OTHER_PATHS: [&str; 8] = [
    "projectile.nose",
    "projectile.nose.shape",
    "projectile.nose.caliber_radius_head",
    "projectile.nose.length_ratio",
    "projectile.nose.radius_ratio",
    "target.layer",
    "perforation.criterion",
    "title",
];

const DIALECT: Dialect = Dialect {
    root: "the scene",
    table: |path| match path {
        "projectile.nose" => "the nose".to_owned(),
        "stage" | "target.layer" => format!("[[{path}]]"),
        _ => format!("[{path}]"),
    },
    remedy: |path| match path {
        "title" => "put the title in quotes".to_owned(),
        "projectile.nose" => "write nose = { factor = 0.72 }".to_owned(),
        "projectile.nose.shape" => "write shape = \"flat\"".to_owned(),
        "perforation.criterion" => "write criterion = \"full-depth\"".to_owned(),
        "stage" | "target.layer" => format!("write each as [[{path}]]"),
        _ => format!("write [{path}]"),
    },
    unknown: |path, word| {
        if path == "perforation.criterion" {
            return (DIALECT.remedy)(path);
        }
        let listed = LayerNumber::ALL.map(|which| Parameter::Layer(0, which)).into_iter();
        let numbers = Parameter::PLAIN.into_iter().chain(listed);
        let numbers = numbers.chain(StageNumber::ALL.map(|which| Parameter::Stage(0, which)));
        let paths = numbers.map(|number| number.entry().path.replace(".*", ""));
        let mut homes = paths.chain(OTHER_PATHS.map(str::to_owned)).filter_map(|path| {
            let (home, key) = path.rsplit_once('.')?;
            (key == word).then(|| format!("`{word}` belongs to {}", (DIALECT.table)(home)))
        });
        homes.next().unwrap_or_else(|| "remove it".to_owned())
    },
};

type Span = std::ops::Range<usize>;

/// Reads the numbers of a file.
struct Reader<'t> {
    text: &'t str,
    given: Vec<(Parameter, Quantity)>,
}

impl Reader<'_> {
    /// The header or the braces of a table, the key `key` where dotted keys alone make it.
    fn place<T>(&self, key: &str, table: &Spanned<T>) -> Span {
        let span = table.span();
        if span.is_empty() { key_span(self.text, key, span) } else { span }
    }

    /// The number `parameter`; `None` when absent.
    fn number(&mut self, parameter: Parameter, number: Option<&Number>) -> Result<Option<f64>, Fault> {
        let (entry, Some(number)) = (parameter.entry(), number) else { return Ok(None) };
        let quantity = self.quantity(parameter.key(), entry.dimension, entry.range, number)?;
        let value = quantity.value;
        self.given.push((parameter, quantity));
        Ok(Some(value))
    }

    /// The number `parameter` or its default; `table` is the place of its table.
    fn value(&mut self, parameter: Parameter, number: Option<&Number>, table: &Span) -> Result<f64, Fault> {
        let entry = parameter.entry();
        match (self.number(parameter, number)?, entry.absence) {
            (Some(value), _) | (None, Absence::Is(value)) => Ok(value),
            (None, Absence::Refused(example) | Absence::Means(example)) => {
                let path = entry.path.rsplit_once('.').map_or("", |(table, _)| table).replace(".*", "");
                Err(missing(&path, table, parameter.key(), example))
            }
        }
    }

    /// A quantity, `"number unit"` or a bare number in SI units; without a dimension a plain number.
    fn quantity(
        &self,
        key: &str,
        dimension: Option<Dimension>,
        range: Range,
        number: &Number,
    ) -> Result<Quantity, Fault> {
        let span = number.span();
        let raw = self.text.get(span.clone()).unwrap_or_default();
        let value = DeValue::parse(raw).ok().map(Spanned::into_inner);
        let read = match (&value, value.as_ref().and_then(bare), dimension) {
            (_, Some(bare), _) => bare,
            (Some(DeValue::String(text)), None, Some(dimension)) => Quantity::with_unit(text, dimension),
            _ => {
                let (wanted, example) = match dimension.map(|dimension| (dimension.noun(), dimension.units()[0])) {
                    Some((noun, si)) => {
                        (format!("a {noun}: \"number unit\", or a bare number in {si}"), format!("\"1 {si}\""))
                    }
                    None => (format!("{}, without unit or quotes", range.description()), range.example().to_owned()),
                };
                let message = format!("`{key}` is {}", type_at(raw));
                let help = format!("write for instance {key} = {example}");
                return Err(Fault::new(span, message, format!("must be {wanted}"), help));
            }
        };
        let read = read.map_err(|error| match (&value, dimension) {
            (Some(DeValue::String(text)), Some(dimension)) => self.bad_quantity(key, number, text, dimension, &error),
            _ => Fault::new(span.clone(), format!("`{key}`: {error}"), range.description(), "correct the number"),
        })?;
        if range.contains(read.value) {
            return Ok(read);
        }
        let in_si = dimension.map_or(String::new(), |dimension| {
            format!("; it is read in {} as {}", dimension.units()[0], Shown(read.value))
        });
        let message = format!("{} is out of range", quoted(&format!("{key} = {raw}")));
        Err(Fault::new(span, message, range.description(), format!("correct `{key}`{in_si}")))
    }

    fn bad_quantity(
        &self,
        key: &str,
        number: &Number,
        text: &str,
        dimension: Dimension,
        error: &QuantityError,
    ) -> Fault {
        let (noun, known) = (dimension.noun(), dimension.units());
        let mut allowed = format!("a {noun}, in {} and others", known.join(", "));
        let (span, message, help) = match error {
            QuantityError::UnknownUnit { unit } => {
                let help = if unit.starts_with(',') {
                    "write a decimal point, and no separators between thousands".to_owned()
                } else if unit.starts_with(|c: char| c.is_ascii_digit()) {
                    "write the number without blanks inside".to_owned()
                } else {
                    nearest(unit, known).map_or_else(|| format!("give it in {}", known[0]), did_you_mean)
                };
                (self.part(number, text, unit), format!("{} is no unit that is known", quoted(unit)), help)
            }
            QuantityError::WrongDimension { unit, has } => (
                self.part(number, text, unit),
                format!("`{key}` takes a {noun}; {} is a unit of {}", quoted(unit), has.noun()),
                format!("give it in {}", known[0]),
            ),
            QuantityError::NoUnit => (
                number.span(),
                format!("`{key}` has no unit"),
                format!("append one, or leave out the quotes for {}", known[0]),
            ),
            QuantityError::NoNumber => (
                number.span(),
                format!("`{key}` is no quantity: {error}"),
                format!("write for instance {key} = \"1 {}\"", known[0]),
            ),
            QuantityError::NotFinite | QuantityError::TooSmall => {
                "a finite number".clone_into(&mut allowed);
                (number.span(), format!("`{key}`: {error}"), "correct the number".to_owned())
            }
        };
        Fault::new(span, message, allowed, help)
    }

    /// Span of `part` within the string `number`; of the whole value where escapes moved the text.
    fn part(&self, number: &Number, text: &str, part: &str) -> Span {
        let whole = number.span();
        let raw = self.text.get(whole.clone()).unwrap_or_default();
        match (raw.find(text), text.rfind(part)) {
            (Some(start), Some(offset)) => {
                let start = whole.start + start + offset;
                start..start + part.len()
            }
            _ => whole,
        }
    }

    /// Refuses the first of the `keys` in `section` that is given, `why` being what is allowed.
    fn without(&self, section: &str, keys: &[(&str, Option<Span>)], why: &str) -> Result<(), Fault> {
        let given = keys.iter().filter_map(|(key, value)| Some((key, key_span(self.text, key, value.clone()?))));
        match given.min_by_key(|(_, span)| span.start) {
            None => Ok(()),
            Some((key, span)) => {
                let message = format!("`{key}` has no place in {section} here");
                Err(Fault::new(span, message, why, format!("remove `{key}`")))
            }
        }
    }

    fn scene(&mut self, file: SceneTable) -> Result<Scene, Fault> {
        let missing = |header: &str, help: &str| {
            let message = format!("the scene has no {header}");
            Fault::new(0..0, message, format!("{header} is required"), format!("add {help}"))
        };
        let velocity = match &file.impact {
            None => None,
            Some(impact) => {
                let section = self.place("impact", impact);
                Some(self.value(Parameter::Velocity, impact.get_ref().velocity.as_ref(), &section)?)
            }
        };
        let criterion = file.perforation.and_then(|perforation| perforation.criterion);
        if let (Some(criterion), Some(_)) = (&criterion, &file.stage)
            && *criterion.get_ref() == Criterion::Ndrc
        {
            return Err(Fault::new(
                criterion.span(),
                "`ndrc` needs a projectile diameter, and a scene of stages has none",
                "`full-depth` in a scene of stages",
                (DIALECT.remedy)("perforation.criterion"),
            ));
        }
        let criterion = criterion.map(Spanned::into_inner).unwrap_or_default();
        let projectile =
            file.projectile.ok_or_else(|| missing("[projectile]", "[projectile] with mass, diameter and nose"))?;
        let section = self.place("projectile", &projectile);
        let projectile = projectile.into_inner();
        let mass = self.value(Parameter::Mass, projectile.mass.as_ref(), &section)?;
        let (resistance, thickness) = if let Some(stages) = file.stage {
            self.without(
                "[projectile]",
                &[("diameter", span(projectile.diameter.as_ref())), ("nose", span(projectile.nose.as_ref()))],
                "with [[stage]], [projectile] has only `mass`",
            )?;
            let resistance = [("resistance", span(file.resistance.as_ref()))];
            self.without("the scene", &resistance, "with [[stage]] there is no [resistance]")?;
            let target = file.target.as_ref().map(Spanned::get_ref);
            self.stages(&stages, target)?
        } else {
            let target =
                file.target.ok_or_else(|| missing("[target]", "[target] with strength and density, or stages"))?;
            let resistance = file.resistance.map(Spanned::into_inner).unwrap_or_default();
            self.concrete(&projectile, &section, &target, &resistance)?
        };
        Ok(Scene { title: file.title, mass, resistance, thickness, criterion, velocity })
    }

    /// The resistance of stages given outright, and the thickness of the target.
    fn stages(
        &mut self,
        tables: &Spanned<Vec<Spanned<StageTable>>>,
        target: Option<&TargetTable>,
    ) -> Result<(Resistance, Option<f64>), Fault> {
        let count = self.at_least_one("stage", tables)?;
        let mut thickness = None;
        if let Some(target) = target {
            let keys = [
                ("strength", span(target.strength.as_ref())),
                ("density", span(target.density.as_ref())),
                ("layer", span(target.layer.as_ref())),
            ];
            self.without("[target]", &keys, "with [[stage]], [target] has only `thickness`")?;
            thickness = self.number(Parameter::Thickness, target.thickness.as_ref())?;
        }
        let mut stages: Vec<Stage> = Vec::with_capacity(count);
        for (index, table) in tables.get_ref().iter().enumerate() {
            let section = self.place("stage", table);
            let table = table.get_ref();
            let mut value =
                |which, number: &Option<Number>| self.value(Parameter::Stage(index, which), number.as_ref(), &section);
            let stage = Stage {
                static_force: value(StageNumber::StaticForce, &table.static_force)?,
                stiffness: value(StageNumber::Stiffness, &table.stiffness)?,
                viscosity: value(StageNumber::Viscosity, &table.viscosity)?,
                drag: value(StageNumber::Drag, &table.drag)?,
                end: value(StageNumber::End, &table.end)?,
            };
            if stage.end.is_infinite() && index + 1 < count {
                return Err(Fault::new(
                    section,
                    "this stage has no `end`, and another follows",
                    "only the last stage goes without an `end`",
                    "give it an `end`, or remove the stages behind it",
                ));
            }
            let end = span(table.end.as_ref()).unwrap_or_default();
            let previous = stages.last().map_or(0.0, |previous| previous.end);
            if stage.end < previous {
                return Err(Fault::new(
                    end,
                    format!("this stage ends at {} m, in front of where it begins", Shown(stage.end)),
                    format!("an end at {} m or beyond", Shown(previous)),
                    "give the ends in order, each from the impact face",
                ));
            }
            if index + 1 == count && stage.end < thickness.unwrap_or(f64::INFINITY) {
                return Err(Fault::new(
                    end,
                    "the last stage ends inside the target",
                    "no `end` in the last stage, or one at the target's thickness or beyond",
                    "leave out this `end`, or add the stage that follows",
                ));
            }
            stages.push(stage);
        }
        Ok((Resistance::Stages(stages), thickness))
    }

    /// How many tables the array at `path` has.
    fn at_least_one<T>(&self, path: &'static str, tables: &Spanned<Vec<T>>) -> Result<usize, Fault> {
        let key = path.rsplit('.').next().unwrap_or(path);
        match tables.get_ref().len() {
            0 => Err(Fault::new(
                self.place(key, tables),
                format!("`{key}` is empty"),
                "at least one table",
                (DIALECT.remedy)(path),
            )),
            count => Ok(count),
        }
    }

    /// The resistance of Eq. 4-5, and the thickness of the target.
    fn concrete(
        &mut self,
        projectile: &ProjectileTable,
        section: &Span,
        target: &Spanned<TargetTable>,
        resistance: &ResistanceTable,
    ) -> Result<(Resistance, Option<f64>), Fault> {
        let diameter = self.value(Parameter::Diameter, projectile.diameter.as_ref(), section)?;
        let nose =
            projectile.nose.as_ref().ok_or_else(|| missing("projectile", section, "nose", "{ shape = \"flat\" }"))?;
        let nose_factor = self.nose_factor(nose)?;
        let static_factor = self.number(Parameter::StaticFactor, resistance.static_factor.as_ref())?;
        let inertia_factor = self.value(Parameter::InertiaFactor, resistance.inertia_factor.as_ref(), section)?;
        let crater_ratio = self.value(Parameter::CraterRatio, resistance.crater_ratio.as_ref(), section)?;
        let crater_stiffness = self.crater_stiffness(resistance.crater_stiffness.as_ref())?;
        let section = self.place("target", target);
        let target = target.get_ref();
        let layers =
            target.layer.as_ref().map_or(Ok(Vec::new()), |layers| self.layers(target, layers, static_factor))?;
        let (medium, thickness) = if let Some(index) = layer_beyond(&layers, crater_ratio * diameter) {
            (layers[index], self.total_thickness(target, &layers)?)
        } else {
            let thickness = self.number(Parameter::Thickness, target.thickness.as_ref())?;
            let strength = self.value(Parameter::Strength, target.strength.as_ref(), &section)?;
            let density = self.value(Parameter::Density, target.density.as_ref(), &section)?;
            (medium(strength, density, static_factor), thickness)
        };
        let concrete = Concrete {
            diameter,
            nose_factor,
            strength: medium.strength,
            density: medium.density,
            static_factor: medium.static_factor,
            inertia_factor,
            crater_ratio,
            crater_stiffness,
            layers,
        };
        Ok((Resistance::Concrete(concrete), thickness))
    }

    /// The layers from the impact face on.
    fn layers(
        &mut self,
        target: &TargetTable,
        tables: &Spanned<Vec<Spanned<LayerTable>>>,
        static_factor: Option<f64>,
    ) -> Result<Vec<Layer>, Fault> {
        let count = self.at_least_one("target.layer", tables)?;
        let keys = [
            ("strength", span(target.strength.as_ref())),
            ("density", span(target.density.as_ref())),
            ("thickness", span(target.thickness.as_ref())),
        ];
        self.without("[target]", &keys, "with [[target.layer]], each layer has its own")?;
        let mut layers = Vec::with_capacity(count);
        for (index, table) in tables.get_ref().iter().enumerate() {
            let section = self.place("layer", table);
            let table = table.get_ref();
            let layer = |which| Parameter::Layer(index, which);
            let thickness = match &table.thickness {
                None if index + 1 == count => f64::INFINITY,
                thickness => self.value(layer(LayerNumber::Thickness), thickness.as_ref(), &section)?,
            };
            let own_factor = match &table.static_factor {
                // A number given is positive; zero is for what Eq. 14 leaves to an air gap.
                Some(number) => {
                    self.quantity("S", None, Parameter::StaticFactor.entry().range, number)?;
                    self.number(layer(LayerNumber::StaticFactor), Some(number))?
                }
                None => static_factor,
            };
            let viscosity = self.value(layer(LayerNumber::Viscosity), table.viscosity.as_ref(), &section)?;
            let strength = self.value(layer(LayerNumber::Strength), table.strength.as_ref(), &section)?;
            let density = self.value(layer(LayerNumber::Density), table.density.as_ref(), &section)?;
            layers.push(Layer { thickness, viscosity, ..medium(strength, density, own_factor) });
        }
        Ok(layers)
    }

    /// H of a layered target; `None` when the last layer has no end.
    fn total_thickness(&self, target: &TargetTable, layers: &[Layer]) -> Result<Option<f64>, Fault> {
        // Summed from the face on, as the ends of the layers are.
        let sum = layers.iter().fold(0.0, |sum, layer| sum + layer.thickness);
        let open = layers.last().is_some_and(|last| last.thickness.is_infinite());
        if !open && sum.is_infinite() {
            let place = key_span(self.text, "layer", span(target.layer.as_ref()).unwrap_or_default());
            let message = "the layers sum up to no finite thickness";
            return Err(Fault::new(place, message, "a finite sum", "correct the thicknesses"));
        }
        Ok(Some(sum).filter(|_| !open))
    }

    fn crater_stiffness(&mut self, number: Option<&Number>) -> Result<CraterStiffness, Fault> {
        let span = number.map_or(0..0, Spanned::span);
        let value = DeValue::parse(self.text.get(span.clone()).unwrap_or_default());
        if let Some(text) = value.as_ref().ok().and_then(|value| value.get_ref().as_str()) {
            if text.trim() == "continuous" {
                return Ok(CraterStiffness::Continuous);
            }
            if units::split(text.trim()).0.is_empty() {
                return Err(Fault::new(
                    span,
                    format!("unknown crater stiffness {}", quoted(text)),
                    "`continuous`, or a stiffness such as \"8.48e6 N/m\"",
                    nearest(text, &["continuous"]).map_or_else(|| "write \"continuous\"".to_owned(), did_you_mean),
                ));
            }
        }
        let given = self.number(Parameter::CraterStiffness, number)?;
        Ok(given.map_or(CraterStiffness::Continuous, CraterStiffness::Given))
    }

    /// N* of the nose, given as such or by a shape.
    fn nose_factor(&mut self, nose: &Spanned<NoseTable>) -> Result<f64, Fault> {
        type Shape = (&'static str, Range, fn(f64) -> NoseShape);
        const SHAPES: [Shape; 3] = [
            ("ogive", Range::AtLeastHalf, |psi| NoseShape::Ogive { caliber_radius_head: psi }),
            ("cone", Range::Positive, |psi| NoseShape::Cone { length_ratio: psi }),
            ("spherical", Range::AtLeastHalf, |psi| NoseShape::Spherical { radius_ratio: psi }),
        ];
        let place = self.place("nose", nose);
        let nose = nose.get_ref();
        let numbers = [&nose.caliber_radius_head, &nose.length_ratio, &nose.radius_ratio];
        let ratios = ["caliber_radius_head", "length_ratio", "radius_ratio"];
        let without = |taken: Option<usize>, why: &str| {
            let others: Vec<_> =
                (0..3).filter(|i| Some(*i) != taken).map(|i| (ratios[i], span(numbers[i].as_ref()))).collect();
            self.without("the nose", &others, why)
        };
        let one_of_two = |span, fault: &str, help: &str| {
            Err(Fault::new(span, format!("the nose has {fault}"), "exactly one of `factor` and `shape`", help))
        };
        let (name, span) = match (&nose.factor, &nose.shape) {
            (None, Some(shape)) => (shape.get_ref().as_str(), shape.span()),
            (Some(factor), None) => {
                without(None, "a `factor` takes no parameter of a shape")?;
                return self.value(Parameter::NoseFactor, Some(factor), &place);
            }
            (Some(_), Some(shape)) => {
                let shape = key_span(self.text, "shape", shape.span());
                return one_of_two(shape, "both a `factor` and a `shape`", "remove one of the two");
            }
            (None, None) => {
                let help = "write { factor = 0.72 } or { shape = \"flat\" }";
                return one_of_two(place, "neither a `factor` nor a `shape`", help);
            }
        };
        if name == "flat" {
            without(None, "the shape `flat` takes no parameter")?;
            return Ok(NoseShape::Flat.factor());
        }
        let Some(index) = SHAPES.iter().position(|(shape, ..)| *shape == name) else {
            let known = ["flat", "ogive", "cone", "spherical"];
            let help = nearest(name, &known)
                .map_or_else(|| "give the nose factor: { factor = 0.72 }".to_owned(), did_you_mean);
            let message = format!("unknown nose shape {}", quoted(name));
            return Err(Fault::new(span, message, format!("one of {}", known.join(", ")), help));
        };
        let ((_, range, of), key) = (SHAPES[index], ratios[index]);
        without(Some(index), &format!("the shape `{name}` takes `{key}`"))?;
        let number = numbers[index].as_ref().ok_or_else(|| missing("projectile.nose", &place, key, "3.0"))?;
        Ok(of(self.quantity(key, None, range, number)?.value).factor())
    }
}

fn missing(path: &str, table: &Span, key: &str, example: &str) -> Fault {
    DIALECT.missing(path, table.clone(), key, format!("add {key} = {example}"))
}

fn span<T>(value: Option<&Spanned<T>>) -> Option<Span> {
    value.map(Spanned::span)
}

/// The decimal of a TOML number; `None` for anything else.
fn bare(value: &DeValue<'_>) -> Option<Result<Quantity, QuantityError>> {
    let digits = match value {
        DeValue::Float(float) => float.as_str().replace('_', ""),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().replace('_', ""),
        DeValue::Integer(integer) => u128::from_str_radix(&integer.as_str().replace('_', ""), integer.radix())
            .map_or_else(|_| "inf".to_owned(), |number| number.to_string()),
        _ => return None,
    };
    Some(Quantity::bare(&digits))
}

/// A medium without an end, S from Eq. 14 unless given.
fn medium(strength: f64, density: f64, static_factor: Option<f64>) -> Layer {
    // An air gap has no strength for Eq. 14 to go by, and needs none.
    let eq14 = if strength == 0.0 { 0.0 } else { semi_empirical::static_factor(strength) };
    let static_factor = static_factor.unwrap_or(eq14);
    Layer { thickness: f64::INFINITY, strength, density, static_factor, viscosity: 0.0 }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a missing value is a failed test")]
mod tests;
