//! Which scene a TOML file describes, and where and why a file describes none (docs/reference.md, "Scene files").
//!
//! Every refusal is a [`SceneError`]: it underlines the offending text and says what is allowed and what to do.
//! Nothing is skipped or guessed: an unknown key is refused, so a misspelt optional one cannot be silently ignored.
//! Tables and keys are the [`paths`] of the numbers of a scene; dimension, range and default of a number are those of
//! [`Parameter::entry`].

use std::collections::BTreeMap;
use std::path::Path;

use strum::VariantNames;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::diagnostic::{
    Dialect, Fault, SceneError, Span, did_you_mean, key_of, nearest, parse, quoted, read_text, type_of,
};
use super::input;
use crate::physics::decimals::Written;
use crate::physics::expression::{ExpressionError, Known, Tape, Unit, is_name, is_reserved};
use crate::physics::law::{Name, OwnParameter};
use crate::physics::nose::NoseShape;
use crate::physics::parameter::{Absence, LayerNumber, Parameter, StageNumber};
use crate::physics::scene::{
    Concrete, CraterStiffness, Criterion, Ending, Force, Layer, OwnEnd, Range, Resistance, Scene, layer_beyond,
};
use crate::physics::units::{self, Dimension, Quantity, QuantityError};
use crate::physics::{Plug, Stage, semi_empirical};
use crate::text::Shown;

mod force_table;
mod schema;

pub use schema::schema;

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
    "plug",
    "layer-at-crater-end",
    "loaded-spring",
    "spring-and-drag",
    "overdamped",
    "constant-force",
    "softening",
    "law-robins-euler",
    "law-poncelet",
    "law-resal",
    "law-power",
    "law-forrestal-1994",
    "law-frew",
    "law-cavity-expansion",
    "law-vitman-stepanov",
    "law-rosenberg-dekel",
    "law-petry",
    "law-ndrc",
    "law-ceb-rate",
    "law-johnson-cook-rate",
    "law-free-surface",
    "law-two-layers",
    "law-allen",
    "law-plug",
    "law-speed-table",
];

/// The text of the shipped scene `name`.
pub fn shipped(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
}

/// What to do about `name`, which no shipped scene has: the one that it resembles, or else `otherwise`.
pub(crate) fn shipped_like(name: &str, otherwise: &str) -> String {
    let names: Vec<_> = SHIPPED.iter().map(|(name, _)| *name).collect();
    nearest(name, &names).map_or_else(|| otherwise.to_owned(), did_you_mean)
}

/// Name and text of the scene file at `path`; where there is no file, of the shipped scene of that name.
///
/// # Errors
/// [`SceneError`]: as [`Scene::read`], before the text is understood.
pub fn text_at(path: &Path) -> Result<(String, String), Box<SceneError>> {
    let is_file = input::is_file(path);
    if let Some((name, text)) = path.to_str().filter(|_| !is_file).and_then(|name| Some((name, shipped(name)?))) {
        return Ok((name.to_owned(), text.to_owned()));
    }
    read_text(path).map_err(|mut error| {
        if !path.exists() {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            "a file, the name of a scene that ships, or `-` for standard input".clone_into(&mut error.allowed);
            error.help = shipped_like(&name, "check the path; `penetrode scenes` lists the scenes that ship");
        }
        error
    })
}

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
        SceneFile::from_toml(text, file, &[]).map(|read| read.scene)
    }

    /// The scene in the file at `path`; `-` is standard input. Where there is no such file, the scene of that name that
    /// ships ([`SHIPPED`]).
    ///
    /// # Errors
    /// [`SceneError`]: the file cannot be read, is larger than 1 MiB (it is then not read), is not UTF-8, or is
    /// not a scene.
    pub fn read(path: &Path) -> Result<Self, Box<SceneError>> {
        Self::read_with(path, &[])
    }

    /// As [`Scene::read`], with `settings` as in [`SceneFile::from_toml`].
    ///
    /// # Errors
    /// As [`Scene::read`]; also a setting that is none, or that the scene cannot have.
    pub fn read_with(path: &Path, settings: &[String]) -> Result<Self, Box<SceneError>> {
        SceneFile::read(path, settings).map(|read| read.scene)
    }
}

/// A scene, and the decimals that its numbers were read from.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The scene.
    pub scene: Scene,
    /// Every number that the file itself gives and the scene holds; rows of tables beside it are not. A computation that must
    /// enclose the numbers as written, and not as rounded to `f64`, starts from these.
    pub written: Written,
}

impl SceneFile {
    /// The scene file at `path`, or the shipped scene of that name, with the `settings` of [`SceneFile::from_toml`].
    ///
    /// # Errors
    /// As [`Scene::read_with`].
    pub fn read(path: &Path, settings: &[String]) -> Result<Self, Box<SceneError>> {
        let (file, text) = text_at(path)?;
        Self::from_toml(&text, &file, settings)
    }

    /// The scene file `text`, where each of the `settings`, such as `target.thickness=0.3 m`, stands as if the file gave
    /// it, in place of what the file gives there. All numbers and words of a scene file can be set, with values as there
    /// but without quotes; a nose factor or shape replaces the whole nose of the file.
    ///
    /// # Errors
    /// As [`Scene::from_toml`]; also a setting that is none, or that the scene cannot have.
    pub fn from_toml(text: &str, file: &str, settings: &[String]) -> Result<Self, Box<SceneError>> {
        // One text, one line for each setting behind the file: a span tells which of them is at fault.
        let lines = || settings.iter().map(String::as_str);
        let whole = [text].into_iter().chain(lines()).collect::<Vec<_>>().join("\n");
        let read = parse(&whole[..text.len()]).and_then(|mut root| {
            check(root.get_ref(), "")?;
            let units = units_of_parameters(root.get_ref());
            let mut start = text.len() + 1;
            for line in lines() {
                set(root.get_mut(), &whole, start..start + line.len(), text.len())?;
                start += line.len() + 1;
            }
            let mut reader = Reader { file, text: &whole, root, units, written: Written::default() };
            Ok(Self { scene: reader.scene()?, written: reader.written })
        });
        read.map_err(|mut fault| {
            let mut source = (file, text);
            for line in lines() {
                let next = source.1.len() + 1;
                if fault.span.start >= next {
                    fault.span = fault.span.start - next..fault.span.end - next;
                    source = ("--set", line);
                }
            }
            fault.in_file(source.0, source.1)
        })
    }
}

/// Paths of texts.
const WORDS: [&str; 8] = [
    "projectile.nose.shape",
    "perforation.criterion",
    "title",
    "stage.*.force.table",
    "stage.*.force.x",
    "stage.*.force.V",
    "stage.*.force.force",
    UNTIL,
];

/// Path of the condition on which a stage ends.
const UNTIL: &str = "stage.*.until";

/// Path of the force of a stage in place of its coefficients.
const FORCE: &str = "stage.*.force";

/// The table of parameters, whose keys are names of the file's own.
const PARAMETERS: &str = "parameters";

/// Paths of numbers that shape a nose, and are none of the scene itself.
const RATIOS: [&str; 4] = [
    "projectile.nose.caliber_radius_head",
    "projectile.nose.length_ratio",
    "projectile.nose.radius_ratio",
    "projectile.nose.tip_ratio",
];

/// What [projectile] has besides its mass, unless the force is given by stages.
const MATERIAL_OF_PROJECTILE: [&str; 2] = ["projectile.diameter", "projectile.nose"];

/// What [target] has besides its thickness, unless the force is given by stages; layers stand for the first two.
const MATERIAL_OF_TARGET: [&str; 3] = ["target.strength", "target.density", "target.layer"];

/// What [perforation] has with the criterion `plug` alone.
const PLUG: [&str; 2] = ["perforation.half_angle", "perforation.shear_strength"];

/// What [target] leaves to its layers, where it has any.
const LAYERED_TARGET: [&str; 3] = ["target.strength", "target.density", "target.thickness"];

/// A shape of a nose: its name, path and range of each ratio that it takes, and what they make.
type Shape = (&'static str, &'static [(&'static str, Range)], fn(&[f64]) -> NoseShape);

/// The shapes of a nose.
const NOSES: [Shape; 7] = [
    ("flat", &[], |_| NoseShape::Flat),
    ("ogive", &[(RATIOS[0], Range::AtLeastHalf)], |r| NoseShape::Ogive { caliber_radius_head: r[0] }),
    ("cone", &[(RATIOS[1], Range::Positive)], |r| NoseShape::Cone { length_ratio: r[0] }),
    ("spherical", &[(RATIOS[2], Range::AtLeastHalf)], |r| NoseShape::Spherical { radius_ratio: r[0] }),
    ("hemispherical", &[], |_| NoseShape::Spherical { radius_ratio: 0.5 }),
    ("truncated-ogive", &[(RATIOS[0], Range::AtLeastHalf), (RATIOS[3], Range::UnitInterval)], |r| {
        NoseShape::TruncatedOgive { caliber_radius_head: r[0], tip_ratio: r[1] }
    }),
    ("truncated-cone", &[(RATIOS[1], Range::Positive), (RATIOS[3], Range::UnitInterval)], |r| {
        NoseShape::TruncatedCone { length_ratio: r[0], tip_ratio: r[1] }
    }),
];

/// The numbers that a scene file may give, of one layer and one stage.
fn numbers() -> impl Iterator<Item = Parameter> {
    let plain = Parameter::PLAIN.into_iter().filter(|number| number.moves() == *number);
    let layer = LayerNumber::ALL.map(|which| Parameter::Layer(0, which));
    let stage = StageNumber::ALL.map(|which| Parameter::Stage(0, which));
    plain.chain(layer).chain(stage)
}

/// Paths of all that a scene file may hold; `*` stands for an index.
fn paths() -> impl Iterator<Item = &'static str> {
    numbers().map(|number| number.entry().path).chain(WORDS).chain(RATIOS)
}

/// What stands behind `home` and a dot in the paths.
fn below(home: &str) -> impl Iterator<Item = &'static str> {
    let home = if home.is_empty() { String::new() } else { format!("{home}.") };
    paths().filter_map(move |path| path.strip_prefix(&home))
}

/// `path` without the indices of entries.
fn general(path: &str) -> String {
    let is_word = |word: &&str| *word != "*" && word.parse::<usize>().is_err();
    path.split('.').filter(is_word).collect::<Vec<_>>().join(".")
}

const DIALECT: Dialect = Dialect {
    root: "the scene",
    table: |path| match path {
        "projectile.nose" => "the nose".to_owned(),
        "stage.force" => "the force of a stage".to_owned(),
        "stage" | "target.layer" => format!("[[{path}]]"),
        _ => format!("[{path}]"),
    },
    remedy: |path| match path {
        "title" => "put the title in quotes".to_owned(),
        "projectile.nose" => "write nose = { factor = 0.72 }".to_owned(),
        "projectile.nose.shape" => "write shape = \"flat\"".to_owned(),
        "perforation.criterion" => "write criterion = \"full-depth\"".to_owned(),
        "stage.until" => "write for instance until = \"V = v1\"".to_owned(),
        path if path.starts_with("stage.force") => format!("write {}", force_table::EXAMPLE),
        "stage" | "target.layer" => format!("write each as [[{path}]]"),
        _ => format!("write [{path}]"),
    },
    unknown: |path, word| {
        if path == "perforation.criterion" {
            return (DIALECT.remedy)(path);
        }
        let mut homes = paths().filter_map(|path| path.rsplit_once('.')).filter(|(_, key)| *key == word);
        let home = |(home, _): (&str, _)| format!("`{word}` belongs to {}", (DIALECT.table)(&general(home)));
        homes.next().map_or_else(|| "remove it".to_owned(), home)
    },
};

/// Refuses a key of `table`, at `home` in the file, that no scene has, and a value of another type than its key takes.
fn check(table: &DeTable<'_>, home: &str) -> Result<(), Fault> {
    for (key, value) in table {
        let path = if home.is_empty() { key.get_ref().to_string() } else { format!("{home}.{}", key.get_ref()) };
        let mistyped = |value: &Value<'_>, wanted| {
            Err(DIALECT.mistyped(&general(&path), value.span(), type_of(value.get_ref()), wanted))
        };
        match (below(&path).next(), value.get_ref()) {
            (Some(keys), DeValue::Array(entries)) if keys.starts_with("*.") => {
                for entry in entries {
                    let Some(table) = entry.get_ref().as_table() else { return mistyped(entry, "a table") };
                    check(table, &format!("{path}.*"))?;
                }
            }
            (Some(keys), _) if keys.starts_with("*.") => return mistyped(value, "an array"),
            (Some(_), DeValue::Table(table)) => check(table, &path)?,
            (Some(_), DeValue::String(_)) if path == FORCE => {}
            (Some(_), _) if path == FORCE => return mistyped(value, "an expression in quotes, or a table"),
            (Some(_), _) => return mistyped(value, "a table"),
            (None, DeValue::Table(_)) if path == PARAMETERS => {}
            (None, _) if path == PARAMETERS => return mistyped(value, "a table"),
            (None, found) if WORDS.contains(&path.as_str()) => {
                if !found.is_str() {
                    return mistyped(value, "a string");
                }
            }
            (None, _) if paths().any(|known| known == path) => {}
            (None, _) => {
                let mut known = Vec::new();
                let parameters = home.is_empty().then_some(PARAMETERS);
                for word in below(home).filter_map(|rest| rest.split('.').next()).chain(parameters) {
                    if !known.contains(&word) {
                        known.push(word);
                    }
                }
                return Err(DIALECT.unknown_key(&general(home), key.span(), key.get_ref(), &known));
            }
        }
    }
    Ok(())
}

/// Sets in `root` what the setting at `span` of `text` says; the file is the first `file_length` bytes.
fn set<'t>(root: &mut DeTable<'t>, text: &'t str, span: Span, file_length: usize) -> Result<(), Fault> {
    let setting = &text[span.clone()];
    let Some((path, value)) = setting.split_once('=') else {
        return Err(Fault::new(span, "this sets nothing", "PATH=VALUE", "write for instance impact.velocity=300m/s"));
    };
    let (place, path, text) = (span.start..span.start + path.len(), path.trim(), value.trim());
    let value_place = span.end - value.len()..span.end;
    let is_index = |word: &str| word.parse::<usize>().is_ok();
    let general = path.split('.').map(|word| if is_index(word) { "*" } else { word }).collect::<Vec<_>>().join(".");
    let is_parameter = path.strip_prefix(PARAMETERS).and_then(|rest| rest.strip_prefix('.')).is_some_and(is_name);
    if !is_parameter && !paths().any(|known| known == general) {
        let index = path.split('.').find(|word| is_index(word)).unwrap_or("0");
        let of_that_key = || paths().find(|known| key_of(known) == key_of(path));
        let near = nearest(&general, &paths().collect::<Vec<_>>()).or_else(of_that_key);
        let help = match (path.parse::<Parameter>(), near) {
            (Ok(group), _) => format!("set `{}`", group.moves()),
            (Err(_), Some(known)) => did_you_mean(&known.replace('*', index)),
            (Err(_), None) => "docs/reference.md lists all keys of a scene file".to_owned(),
        };
        let allowed = "what a scene file gives, such as target.strength or stage.0.drag";
        return Err(Fault::new(place, format!("no scene file has {}", quoted(path)), allowed, help));
    }
    let value = match DeValue::parse(text).map(Spanned::into_inner) {
        Ok(value) if value.is_str() || (bare(&value).is_some() && !WORDS.contains(&general.as_str())) => value,
        _ => DeValue::String(text.into()),
    };
    let (homes, key) = path.rsplit_once('.').unwrap_or(("", path));
    let mut homes = homes.split('.').filter(|home| !home.is_empty());
    let Some(home) = home_of(root, &mut homes, &place) else {
        let message = format!("the scene has no `{}`", path.trim_end_matches(key).trim_end_matches('.'));
        return Err(Fault::new(place, message, "one that the file gives, counted from 0", "add it to the file"));
    };
    if ["factor", "shape"].contains(&key) {
        *home = std::mem::take(home).into_iter().filter(|(_, value)| value.span().start > file_length).collect();
    }
    if home.remove(key).is_some_and(|old| old.span().start > file_length) {
        return Err(Fault::new(place, format!("`{path}` is set twice"), "each once", "remove one of the two"));
    }
    home.insert(Spanned::new(place, key.into()), Spanned::new(value_place, value));
    Ok(())
}

/// The units of the parameters that the file gives with one; a setting without a unit is of it.
fn units_of_parameters(root: &DeTable<'_>) -> BTreeMap<String, Unit> {
    let parameters = root.get(PARAMETERS).and_then(|table| table.get_ref().as_table());
    let unit = |value: &Value<'_>| Unit::of(&Quantity::with_any_unit(value.get_ref().as_str()?).ok()?.1);
    let units = parameters.into_iter().flatten().map(|(key, value)| (key.get_ref().to_string(), unit(value)));
    units.filter_map(|(key, unit)| Some((key, unit?))).collect()
}

/// The table at `homes`, made where it is none of a list; its keys stand at `place`.
fn home_of<'a, 't>(
    table: &'a mut DeTable<'t>,
    homes: &mut (impl Iterator<Item = &'t str> + Clone),
    place: &Span,
) -> Option<&'a mut DeTable<'t>> {
    let Some(home) = homes.next() else { return Some(table) };
    let index = homes.clone().next().and_then(|word| word.parse::<usize>().ok());
    let inner = if let Some(index) = index {
        homes.next();
        let DeValue::Array(entries) = table.get_mut(home)?.get_mut() else { return None };
        entries.get_mut(index)?
    } else {
        let made = || Spanned::new(place.start..place.start, DeValue::Table(DeTable::new()));
        table.entry(Spanned::new(place.clone(), home.into())).or_insert_with(made)
    };
    let DeValue::Table(inner) = inner.get_mut() else { return None };
    home_of(inner, homes, place)
}

/// What the tables [[stage]] give.
struct Staged {
    stages: Vec<Stage>,
    forces: Vec<(usize, Force)>,
    ends: Vec<(usize, OwnEnd)>,
    parameters: Vec<OwnParameter>,
    thickness: Option<f64>,
}

/// A file as it stands, and the numbers read from it.
struct Reader<'t> {
    /// Its name, beside which its tables are.
    file: &'t str,
    text: &'t str,
    root: Spanned<DeTable<'t>>,
    /// Of parameters, before settings.
    units: BTreeMap<String, Unit>,
    written: Written,
}

type Value<'t> = Spanned<DeValue<'t>>;

impl<'t> Reader<'t> {
    /// The place of the key at `path` and the value there.
    fn at(&self, path: &str) -> Option<(Span, &Value<'t>)> {
        fn entry<'a, 't>(table: &'a DeTable<'t>, key: &str) -> Option<(Span, &'a Value<'t>)> {
            table.get_key_value(key).map(|(key, value)| (key.span(), value))
        }
        let mut words = path.split('.');
        let first = entry(self.root.get_ref(), words.next()?)?;
        words.try_fold(first, |(_, value), word| match value.get_ref() {
            DeValue::Table(table) => entry(table, word),
            other => other.get(word.parse::<usize>().ok()?).map(|value| (value.span(), value)),
        })
    }

    /// The place of what is at `path`: of a table its header or braces, or the key where dotted keys alone make it.
    fn place(&self, path: &str) -> Span {
        let place = |(key, value): (Span, &Value<'t>)| if value.span().is_empty() { key } else { value.span() };
        self.at(path).map_or(0..0, place)
    }

    /// The text at `path`, and its place.
    fn word(&self, path: &str) -> Option<(String, Span)> {
        self.at(path).and_then(|(_, value)| Some((value.get_ref().as_str()?.to_owned(), value.span())))
    }

    /// The number `parameter`; `None` when absent.
    fn number(&mut self, parameter: Parameter) -> Result<Option<f64>, Fault> {
        let Some((_, number)) = self.at(&parameter.to_string()) else { return Ok(None) };
        let entry = parameter.entry();
        let quantity = self.quantity(parameter.key(), entry.dimension, entry.range, number)?;
        let value = quantity.value;
        self.written.numbers.push((parameter, quantity));
        Ok(Some(value))
    }

    /// The number `parameter` or its default.
    fn value(&mut self, parameter: Parameter) -> Result<f64, Fault> {
        match (self.number(parameter)?, parameter.entry().absence) {
            (Some(value), _) | (None, Absence::Is(value)) => Ok(value),
            (None, Absence::Refused(example) | Absence::Means(example)) => {
                Err(self.missing(&parameter.to_string(), example))
            }
        }
    }

    /// Refuses the lack of the key at `path`, of which `example` is a value.
    fn missing(&self, path: &str, example: &str) -> Fault {
        let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
        DIALECT.missing(&general(table), self.place(table), key, format!("add {key} = {example}"))
    }

    /// A quantity, `"number unit"` or a bare number in SI units; without a dimension a plain number.
    fn quantity(
        &self,
        key: &str,
        dimension: Option<Dimension>,
        range: Range,
        number: &Value<'t>,
    ) -> Result<Quantity, Fault> {
        let span = number.span();
        let raw = self.text.get(span.clone()).unwrap_or_default();
        let value = number.get_ref();
        let read = match (value.as_str(), bare(value), dimension) {
            (_, Some(bare), _) => bare,
            (Some(text), None, Some(dimension)) => Quantity::with_unit(text, dimension),
            _ => {
                let (wanted, example) = match dimension.map(|dimension| (dimension.noun(), dimension.units()[0])) {
                    Some((noun, si)) => {
                        (format!("a {noun}: \"number unit\", or a bare number in {si}"), format!("\"1 {si}\""))
                    }
                    None => (format!("{}, without unit or quotes", range.description()), range.example().to_owned()),
                };
                let message = format!("`{key}` is {}", type_of(value));
                let help = format!("write for instance {key} = {example}");
                return Err(Fault::new(span, message, format!("must be {wanted}"), help));
            }
        };
        let read = read.map_err(|error| match (value.as_str(), dimension) {
            (Some(text), Some(dimension)) => self.bad_quantity(key, number, text, dimension, &error),
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
        number: &Value<'t>,
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
            QuantityError::NoNumber | QuantityError::Behind { .. } => (
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
    fn part(&self, number: &Value<'t>, text: &str, part: &str) -> Span {
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

    /// Refuses the first of the `paths` in `section` that is given, `why` being what is allowed.
    fn without(&self, section: &str, paths: &[&str], why: &str) -> Result<(), Fault> {
        let given = paths.iter().filter_map(|path| Some((*path, self.at(path)?.0)));
        match given.min_by_key(|(_, span)| span.start) {
            None => Ok(()),
            Some((path, span)) => {
                let key = key_of(path);
                let message = format!("`{key}` has no place in {section} here");
                Err(Fault::new(span, message, why, format!("remove `{key}`")))
            }
        }
    }

    fn scene(&mut self) -> Result<Scene, Fault> {
        let velocity = self.at("impact").is_some().then(|| self.value(Parameter::Velocity)).transpose()?;
        let (criterion, plug) = self.criterion()?;
        let missing = |header: &str, help: &str| {
            let message = format!("the scene has no {header}");
            Err(Fault::new(0..0, message, format!("{header} is required"), format!("add {help}")))
        };
        if self.at("projectile").is_none() {
            return missing("[projectile]", "[projectile] with mass, diameter and nose");
        }
        let mass = self.value(Parameter::Mass)?;
        let (resistance, thickness, forces, ends, parameters) = if self.at("stage").is_some() {
            self.without("[projectile]", &MATERIAL_OF_PROJECTILE, "with [[stage]], [projectile] has only `mass`")?;
            self.without("the scene", &["resistance"], "with [[stage]] there is no [resistance]")?;
            let Staged { stages, forces, ends, parameters, thickness } = self.stages()?;
            (Resistance::Stages(stages), thickness, forces, ends, parameters)
        } else if self.at("target").is_some() {
            self.without("the scene", &[PARAMETERS], "[parameters] are those of a `force` in a [[stage]]")?;
            let (resistance, thickness) = self.concrete()?;
            (resistance, thickness, Vec::new(), Vec::new(), Vec::new())
        } else {
            return missing("[target]", "[target] with strength and density, or stages");
        };
        let title = self.word("title").map(|(title, _)| title);
        Ok(Scene { title, mass, resistance, forces, ends, thickness, criterion, plug, velocity, parameters })
    }

    fn criterion(&mut self) -> Result<(Criterion, Option<Plug>), Fault> {
        const PATH: &str = "perforation.criterion";
        let (name, span) = self.word(PATH).unwrap_or((<&str>::from(Criterion::default()).to_owned(), 0..0));
        let Ok(criterion) = name.parse::<Criterion>() else {
            return Err(DIALECT.unknown_word(PATH, span, &name, Criterion::VARIANTS));
        };
        if criterion != Criterion::FullDepth && self.at("stage").is_some() {
            return Err(Fault::new(
                span,
                format!("`{name}` needs a projectile diameter, and a scene of stages has none"),
                "`full-depth` in a scene of stages",
                (DIALECT.remedy)(PATH),
            ));
        }
        if criterion != Criterion::Plug {
            self.without("[perforation]", &PLUG, "with criterion = \"plug\" alone")?;
            return Ok((criterion, None));
        }
        let needs = |what: &str, help: &str| {
            Err(Fault::new(span.clone(), format!("`plug` needs {what}"), "a slab of one concrete", help))
        };
        if self.at("target.layer").is_some() {
            return needs("one concrete, and this target has layers", "take `full-depth`");
        }
        if self.at("target.thickness").is_none() {
            return needs("a rear face, and this target has none", "give [target] a thickness, such as \"200 mm\"");
        }
        let half_angle = self.half_angle()?;
        let shear_strength = self.value(Parameter::ShearStrength)?;
        Ok((criterion, Some(Plug { half_angle, shear_strength })))
    }

    /// The half angle of the plug (degrees).
    fn half_angle(&mut self) -> Result<f64, Fault> {
        const ALLOWED: &str = "degrees from 0 to below 90, such as \"60 deg\", or a bare number";
        let parameter = Parameter::HalfAngle;
        let path = parameter.to_string();
        let Some((_, value)) = self.at(&path) else { return Err(self.missing(&path, "\"60 deg\"")) };
        let (span, help) = (value.span(), "write for instance half_angle = \"60 deg\"");
        let refused = |message: String| Fault::new(span.clone(), message, ALLOWED, help);
        let read = match (value.get_ref().as_str(), bare(value.get_ref())) {
            (_, Some(bare)) => bare,
            (Some(text), None) => {
                let (number, unit) = units::split(text.trim());
                if !["deg", "°"].contains(&unit.trim()) {
                    return Err(refused(format!("`half_angle` takes degrees, not {}", quoted(unit.trim()))));
                }
                Quantity::bare(number.trim())
            }
            (None, None) => return Err(refused(format!("`half_angle` is {}", type_of(value.get_ref())))),
        };
        let quantity = read.map_err(|error| refused(format!("`half_angle`: {error}")))?;
        let angle = quantity.value;
        if !parameter.entry().range.contains(angle) {
            return Err(refused(format!("`half_angle` = {} is out of range", Shown(angle))));
        }
        self.written.numbers.push((parameter, quantity));
        Ok(angle)
    }

    /// The resistance of stages given outright, and the thickness of the target.
    fn stages(&mut self) -> Result<Staged, Fault> {
        let count = self.at_least_one("stage")?;
        self.without("[target]", &MATERIAL_OF_TARGET, "with [[stage]], [target] has only `thickness`")?;
        let thickness = self.number(Parameter::Thickness)?;
        let mut stages: Vec<Stage> = Vec::with_capacity(count);
        let parameters = self.parameters()?;
        let (mut forces, mut ends) = (Vec::new(), Vec::new());
        for index in 0..count {
            let places = stages.iter().rev().map(|before| before.end);
            let previous = places.into_iter().find(|end| *end < f64::INFINITY).unwrap_or(0.0);
            let force = self.force(index, previous, &parameters)?;
            let is_law = matches!(force, Some(Force::Expression(_) | Force::SpeedTable(_)));
            forces.extend(force.map(|force| (index, force)));
            let mut value = |which| self.value(Parameter::Stage(index, which));
            let stage = if is_law {
                Stage::of_law(value(StageNumber::End)?)
            } else {
                Stage {
                    static_force: value(StageNumber::StaticForce)?,
                    stiffness: value(StageNumber::Stiffness)?,
                    viscosity: value(StageNumber::Viscosity)?,
                    drag: value(StageNumber::Drag)?,
                    end: value(StageNumber::End)?,
                }
            };
            let own_end = self.own_end(index, index + 1 == count, &parameters)?;
            let has_condition = own_end.as_ref().is_some_and(|end| end.condition.is_some());
            ends.extend(own_end.map(|end| (index, end)));
            if stage.end.is_infinite() && index + 1 < count && !has_condition {
                return Err(Fault::new(
                    self.place(&format!("stage.{index}")),
                    "this stage has no `end`, and another follows",
                    "only the last stage goes without an `end`, an `end_velocity` or an `until`",
                    "give it an `end`, or remove the stages behind it",
                ));
            }
            let end = self.place(&format!("stage.{index}.end"));
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
        self.used(&parameters, &forces, &ends)?;
        Ok(Staged { stages, forces, ends, parameters, thickness })
    }

    /// The parameters, in the order of the file.
    fn parameters(&mut self) -> Result<Vec<OwnParameter>, Fault> {
        let mut parameters = Vec::new();
        let Some((_, table)) = self.at(PARAMETERS) else { return Ok(parameters) };
        let mut given = Vec::new();
        for (key, number) in table.get_ref().as_table().into_iter().flatten() {
            let name = key.get_ref();
            let (Some(name), false) = (Name::new(name), is_reserved(name)) else {
                let allowed = "a letter, then letters, digits and _, and none of x, V, pi, e or a function";
                let message = format!("no parameter can have the name {}", quoted(name));
                return Err(Fault::new(key.span(), message, allowed, "give it another name"));
            };
            let (quantity, unit) = self.own_quantity(name.text(), number)?;
            parameters.push(OwnParameter { name, value: quantity.value, unit });
            given.push((Parameter::Own(name), quantity));
        }
        self.written.numbers.extend(given);
        Ok(parameters)
    }

    /// A number with any unit, or a plain one.
    fn own_quantity(&self, key: &str, number: &Value<'t>) -> Result<(Quantity, Unit), Fault> {
        const ALLOWED: &str = "a plain number, or \"number unit\", such as 0.15, \"848 kN\" and \"1.2 kN s/m\"";
        let value = number.get_ref();
        let read = match (value.as_str(), bare(value)) {
            (_, Some(bare)) => {
                let unit = self.units.get(key).copied().unwrap_or(Unit::NONE);
                bare.map(|quantity| (quantity, Some(unit)))
            }
            (Some(text), None) => Quantity::with_any_unit(text).map(|(quantity, powers)| (quantity, Unit::of(&powers))),
            (None, None) => {
                let message = format!("`{key}` is {}", type_of(value));
                return Err(Fault::new(number.span(), message, ALLOWED, format!("write for instance {key} = 0.15")));
            }
        };
        let (quantity, unit) = read.map_err(|error| {
            let text = value.as_str().unwrap_or_default();
            let (span, help) = match &error {
                QuantityError::UnknownUnit { unit } => {
                    (self.part(number, text, unit), "units are those of docs/reference.md")
                }
                QuantityError::NoUnit => (number.span(), "append a unit, or leave out the quotes for a plain number"),
                _ => (number.span(), "correct the number"),
            };
            Fault::new(span, format!("`{key}`: {error}"), ALLOWED, help)
        })?;
        let unit = unit.ok_or_else(|| {
            Fault::new(number.span(), format!("the unit of `{key}` has too high a power"), ALLOWED, "correct the unit")
        })?;
        Ok((quantity, unit))
    }

    /// The force `text` at `whole` in the file, an expression of `parameters`.
    fn expression(&self, text: &str, whole: Span, parameters: &[OwnParameter]) -> Result<Tape, Fault> {
        self.of_parameters(text, whole, parameters, |known| Tape::read(text, known, Dimension::Force.into()))
    }

    /// The equation `text` at `whole` in the file, of x or V and of `parameters`.
    fn equation(&self, text: &str, whole: Span, parameters: &[OwnParameter]) -> Result<Tape, Fault> {
        let read = |known: &[Known<'_>]| Tape::read_equation(text, known);
        let tape = self.of_parameters(text, whole.clone(), parameters, read)?;
        if !(tape.depends_on_x() || tape.depends_on_v()) {
            let message = "neither x nor V is in this equation, so that it never becomes true";
            return Err(Fault::new(whole, message, "an equation of x, V or both", "write for instance \"V = v1\""));
        }
        Ok(tape)
    }

    /// What `read` makes of `text` at `whole` in the file, where `parameters` are known.
    fn of_parameters(
        &self,
        text: &str,
        whole: Span,
        parameters: &[OwnParameter],
        read: impl Fn(&[Known<'_>]) -> Result<Tape, ExpressionError>,
    ) -> Result<Tape, Fault> {
        let known = |one: &OwnParameter| Known { name: one.name.text(), value: one.value, unit: one.unit };
        let known: Vec<_> = parameters.iter().map(known).collect();
        read(&known).map_err(|error| {
            // Where escapes moved the text, the whole is underlined.
            let raw = self.text.get(whole.clone()).unwrap_or_default();
            let span = raw.find(text).map_or(whole.clone(), |start| {
                let start = whole.start + start;
                start + error.span.start..start + error.span.end
            });
            Fault::new(span, error.message, error.label, error.help)
        })
    }

    /// How the stage `index` ends besides at a depth, and what joins the projectile there.
    fn own_end(&mut self, index: usize, is_last: bool, parameters: &[OwnParameter]) -> Result<Option<OwnEnd>, Fault> {
        let velocity = Parameter::Stage(index, StageNumber::EndVelocity);
        let mass = Parameter::Stage(index, StageNumber::AddMass);
        let until = format!("stage.{index}.until");
        let given = [&velocity.to_string(), &until, &mass.to_string()].map(|path| self.at(path).map(|(key, _)| key));
        if let Some(key) = given.iter().flatten().next()
            && is_last
        {
            return Err(Fault::new(
                key.clone(),
                "the last stage ends here, and nothing follows",
                "a stage that another follows",
                "add the stage that follows, or remove this",
            ));
        }
        if let (Some(_), Some(key)) = (&given[0], &given[1]) {
            let (message, allowed) = ("this stage ends on two conditions", "one of `end_velocity` and `until`");
            return Err(Fault::new(key.clone(), message, allowed, "remove one of the two"));
        }
        let is_there = |key: &str| self.at(&format!("stage.{index}.force.{key}")).is_some();
        let (is_table, is_of_velocity) = (is_there("table"), is_there("V"));
        let excluded = given[1].as_ref().or(given[0].as_ref().filter(|_| !is_of_velocity));
        if let (Some(key), true) = (excluded, is_table) {
            let message = "this stage has a table for its force, and ends on a condition";
            let help = "write the force as an expression, or end the stage at a depth";
            let allowed = if is_of_velocity {
                "an `end` or an `end_velocity` beside a table of velocity"
            } else {
                "an `end` beside a table of depth"
            };
            return Err(Fault::new(key.clone(), message, allowed, help));
        }
        let condition = match self.number(velocity)? {
            Some(velocity) => Some(Ending::Velocity(velocity)),
            None => match self.word(&until) {
                Some((text, whole)) => Some(Ending::Until(self.equation(&text, whole, parameters)?)),
                None => None,
            },
        };
        let add_mass = self.number(mass)?;
        Ok((condition.is_some() || add_mass.is_some()).then_some(OwnEnd { condition, add_mass }))
    }

    /// Refuses a parameter that no force and no end uses.
    fn used(
        &self,
        parameters: &[OwnParameter],
        forces: &[(usize, Force)],
        ends: &[(usize, OwnEnd)],
    ) -> Result<(), Fault> {
        let uses = |force: &Force, index: usize| matches!(force, Force::Expression(tape) if tape.uses(index));
        let ends_by =
            |end: &OwnEnd, index: usize| matches!(&end.condition, Some(Ending::Until(tape)) if tape.uses(index));
        let is_used = |index: usize| {
            forces.iter().any(|(_, force)| uses(force, index)) || ends.iter().any(|(_, end)| ends_by(end, index))
        };
        match parameters.iter().enumerate().find(|(index, _)| !is_used(*index)) {
            None => Ok(()),
            Some((_, one)) => {
                let name = one.name.text();
                let place = self.at(&format!("{PARAMETERS}.{name}")).map_or(0..0, |(key, _)| key);
                let message = format!("no force uses the parameter `{name}`");
                Err(Fault::new(place, message, "parameters that a `force` uses", format!("remove `{name}`, or use it")))
            }
        }
    }

    /// The force of the stage `index`, which begins at depth `start` (m), where it gives no coefficients.
    fn force(&self, index: usize, start: f64, parameters: &[OwnParameter]) -> Result<Option<Force>, Fault> {
        let home = format!("stage.{index}.force");
        if self.at(&home).is_none() {
            return Ok(None);
        }
        let coefficients = StageNumber::ALL.into_iter().filter(|which| which.is_coefficient());
        let coefficients: Vec<_> = coefficients.map(|which| Parameter::Stage(index, which).to_string()).collect();
        let coefficients: Vec<_> = coefficients.iter().map(String::as_str).collect();
        self.without("a stage with `force`", &coefficients, "`force` and `end`, or coefficients")?;
        if let Some((text, whole)) = self.word(&home) {
            return Ok(Some(Force::Expression(self.expression(&text, whole, parameters)?)));
        }
        let (depth, velocity) = (self.at(&format!("{home}.x")), self.at(&format!("{home}.V")));
        if let (Some(_), Some((key, _))) = (&depth, &velocity) {
            let message = "the table is one of depth and one of velocity";
            let help = "remove one of the two; a force of both is an expression";
            return Err(Fault::new(key.clone(), message, "one of `x` and `V`", help));
        }
        let word = |key: &str, example: &str| {
            self.word(&format!("{home}.{key}")).ok_or_else(|| {
                let help = format!("add {key} = \"{example}\"");
                DIALECT.missing("stage.force", self.place(&home), key, help)
            })
        };
        let name = word("table", "r.csv")?;
        if velocity.is_some() {
            let (v, load) = (word("V", "speed_m_s")?, word("force", "force_kN")?);
            return Ok(Some(Force::SpeedTable(force_table::read_of_velocity(self.file, &name, &v, &load)?)));
        }
        let (x, load) = (word("x", "depth_mm")?, word("force", "force_kN")?);
        let table = force_table::read(self.file, &name, &x, &load)?;
        let (first, last) = (table.first(), table.last());
        if first <= start && start < last {
            return Ok(Some(Force::Table(table)));
        }
        let message = format!("the table goes from x = {} m to {} m", Shown(first), Shown(last));
        let allowed =
            format!("a first row at or before {} m, where the stage begins, and a last one behind it", Shown(start));
        Err(Fault::new(name.1, message, allowed, "add rows to the table; depths count from the impact face"))
    }

    /// How many tables the array at `path` has.
    fn at_least_one(&self, path: &str) -> Result<usize, Fault> {
        let count = self.at(path).and_then(|(_, value)| value.get_ref().as_array()).map_or(0, |array| array.len());
        if count > 0 {
            return Ok(count);
        }
        let message = format!("`{}` is empty", key_of(path));
        Err(Fault::new(self.place(path), message, "at least one table", (DIALECT.remedy)(path)))
    }

    /// The resistance of Eq. 4-5, and the thickness of the target.
    fn concrete(&mut self) -> Result<(Resistance, Option<f64>), Fault> {
        let diameter = self.value(Parameter::Diameter)?;
        let nose_factor = self.nose_factor()?;
        let static_factor = self.number(Parameter::StaticFactor)?;
        let inertia_factor = self.value(Parameter::InertiaFactor)?;
        let crater_ratio = self.value(Parameter::CraterRatio)?;
        let crater_stiffness = self.crater_stiffness()?;
        let layers = if self.at("target.layer").is_some() { self.layers(static_factor)? } else { Vec::new() };
        let (medium, thickness) = if let Some(index) = layer_beyond(&layers, crater_ratio * diameter) {
            (layers[index], self.total_thickness(&layers)?)
        } else {
            let thickness = self.number(Parameter::Thickness)?;
            let (strength, density) = (self.value(Parameter::Strength)?, self.value(Parameter::Density)?);
            (medium(strength, density, static_factor), thickness)
        };
        let concrete = Concrete {
            diameter,
            nose_factor,
            strength: medium.strength,
            density: medium.density,
            static_factor: medium.static_factor,
            follows_eq14: medium.follows_eq14,
            inertia_factor,
            crater_ratio,
            crater_stiffness,
            layers,
        };
        Ok((Resistance::Concrete(concrete), thickness))
    }

    /// The layers from the impact face on.
    fn layers(&mut self, static_factor: Option<f64>) -> Result<Vec<Layer>, Fault> {
        let count = self.at_least_one("target.layer")?;
        self.without("[target]", &LAYERED_TARGET, "with [[target.layer]], each layer has its own")?;
        let mut layers = Vec::with_capacity(count);
        for index in 0..count {
            let layer = |which| Parameter::Layer(index, which);
            let thickness = match self.number(layer(LayerNumber::Thickness))? {
                None if index + 1 == count => f64::INFINITY,
                Some(thickness) => thickness,
                None => self.value(layer(LayerNumber::Thickness))?,
            };
            let own_factor = layer(LayerNumber::StaticFactor);
            if let Some((_, number)) = self.at(&own_factor.to_string()) {
                // A number given is positive; zero is for what Eq. 14 leaves to an air gap.
                self.quantity("S", None, Parameter::StaticFactor.entry().range, number)?;
            }
            let own_factor = self.number(own_factor)?.or(static_factor);
            let viscosity = self.value(layer(LayerNumber::Viscosity))?;
            let strength = self.value(layer(LayerNumber::Strength))?;
            let density = self.value(layer(LayerNumber::Density))?;
            layers.push(Layer { thickness, viscosity, ..medium(strength, density, own_factor) });
        }
        Ok(layers)
    }

    /// H of a layered target; `None` when the last layer has no end.
    fn total_thickness(&self, layers: &[Layer]) -> Result<Option<f64>, Fault> {
        // Summed from the face on, as the ends of the layers are.
        let sum = layers.iter().fold(0.0, |sum, layer| sum + layer.thickness);
        let open = layers.last().is_some_and(|last| last.thickness.is_infinite());
        if !open && sum.is_infinite() {
            let place = self.at("target.layer").map_or(0..0, |(key, _)| key);
            let message = "the layers sum up to no finite thickness";
            return Err(Fault::new(place, message, "a finite sum", "correct the thicknesses"));
        }
        Ok(Some(sum).filter(|_| !open))
    }

    fn crater_stiffness(&mut self) -> Result<CraterStiffness, Fault> {
        if let Some((text, span)) = self.word("resistance.crater_stiffness") {
            if text.trim() == "continuous" {
                return Ok(CraterStiffness::Continuous);
            }
            if units::split(text.trim()).0.is_empty() {
                return Err(Fault::new(
                    span,
                    format!("unknown crater stiffness {}", quoted(&text)),
                    "`continuous`, or a stiffness such as \"8.48e6 N/m\"",
                    nearest(&text, &["continuous"]).map_or_else(|| "write \"continuous\"".to_owned(), did_you_mean),
                ));
            }
        }
        let given = self.number(Parameter::CraterStiffness)?;
        Ok(given.map_or(CraterStiffness::Continuous, CraterStiffness::Given))
    }

    /// N* of the nose, given as such or by a shape.
    fn nose_factor(&mut self) -> Result<f64, Fault> {
        const NOSE: &str = "projectile.nose";
        if self.at(NOSE).is_none() {
            return Err(self.missing(NOSE, "{ shape = \"flat\" }"));
        }
        let without = |taken: &[(&str, Range)], why: &str| {
            let is_taken = |path: &&str| taken.iter().any(|(known, _)| known == path);
            let others: Vec<_> = RATIOS.into_iter().filter(|path| !is_taken(path)).collect();
            self.without("the nose", &others, why)
        };
        let one_of_two = |span, fault: &str, help: &str| {
            Err(Fault::new(span, format!("the nose has {fault}"), "exactly one of `factor` and `shape`", help))
        };
        let (factor, shape) = (self.at("projectile.nose.factor"), self.at("projectile.nose.shape"));
        match (factor, shape) {
            (None, Some(_)) => {}
            (Some(_), None) => {
                without(&[], "a `factor` takes no parameter of a shape")?;
                return self.value(Parameter::NoseFactor);
            }
            (Some(_), Some((key, _))) => {
                return one_of_two(key, "both a `factor` and a `shape`", "remove one of the two");
            }
            (None, None) => {
                let help = "write { factor = 0.72 } or { shape = \"flat\" }";
                return one_of_two(self.place(NOSE), "neither a `factor` nor a `shape`", help);
            }
        }
        let (name, span) = self.word("projectile.nose.shape").unwrap_or_default();
        let Some((_, ratios, of)) = NOSES.into_iter().find(|(shape, ..)| *shape == name) else {
            let known = NOSES.map(|(shape, ..)| shape);
            let help = nearest(&name, &known)
                .map_or_else(|| "give the nose factor: { factor = 0.72 }".to_owned(), did_you_mean);
            let message = format!("unknown nose shape {}", quoted(&name));
            return Err(Fault::new(span, message, format!("one of {}", known.join(", ")), help));
        };
        let keys: Vec<String> = ratios.iter().map(|(path, _)| format!("`{}`", key_of(path))).collect();
        let takes = if keys.is_empty() { "no parameter".to_owned() } else { keys.join(" and ") };
        without(ratios, &format!("the shape `{name}` takes {takes}"))?;
        let mut given = Vec::with_capacity(ratios.len());
        for &(path, range) in ratios {
            let example = if range == Range::UnitInterval { "0.3" } else { "3.0" };
            let (_, number) = self.at(path).ok_or_else(|| self.missing(path, example))?;
            given.push(self.quantity(key_of(path), None, range, number)?);
        }
        let shape = of(&given.iter().map(|ratio| ratio.value).collect::<Vec<_>>());
        if !given.is_empty() {
            self.written.nose = Some((shape, given));
        }
        Ok(shape.factor())
    }
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
    let follows_eq14 = static_factor.is_none();
    let static_factor = static_factor.unwrap_or_else(|| semi_empirical::static_factor_or_none(strength));
    Layer { thickness: f64::INFINITY, strength, density, static_factor, follows_eq14, viscosity: 0.0 }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a missing value is a failed test")]
mod tests;
