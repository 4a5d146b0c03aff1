//! From the text of a scene to its stages, its flight and its critical velocity, beside numbers computed elsewhere; and
//! from a problem to the line that a peer reads.
//!
//! The numbers are those of `verification/references/exact.json`. Its recipe, `exact.py` beside it, is Python at 50 digits and
//! shares nothing with the program: units by their definitions, the scene by docs/theory.md, flights by series of its own.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};
use strum::VariantArray as _;

use super::super::claim::{Found, Measurement, NotMeasured};
use super::super::recorded::{self, RecordedScene};
use super::edges::Violations;
use super::{Subject, Worst, build};
use crate::exchange::peers::wire::PeerScene;
use crate::exchange::peers::{PeerAnswer, PeerRequest};
use crate::exchange::scene_file::{SHIPPED, SceneFile};
use crate::integrators::method::{Method, MethodOptions};
use crate::integrators::{Detail, Flight};
use crate::physics::groups::{self, Groups};
use crate::physics::parameter::{LayerNumber, Parameter, StageNumber};
use crate::physics::semi_empirical::{eq15_printed, eq15_unrounded};
use crate::physics::units::{self, Dimension};
use crate::physics::{
    Advice, CraterStiffness, Criterion, EventKind, Outcome, Problem, Resistance, Scene, Stage, State,
};
use crate::studies::critical_velocity;
use crate::studies::random::Random;
use crate::studies::random_scenes::Generator;

check! {
    /// Every recorded text, read and solved: the worst of its `numbers`, in ulp. An ulp is one of the exact value; in a
    /// flight and in a critical velocity it is ten, or as many as the recorded condition where that is larger.
    ExactText {
        /// Which of its numbers.
        numbers: Numbers,
        /// The texts alone whose problem has a law of its own, or those without; all by default.
        own_laws: Option<bool>,
    } in Input, "ulp", by exact_text, compares (Method | Elsewhere);
    /// Every number of every recorded text, set to what it is, in another unit: numbers that read back as another, and
    /// problems that are another.
    SetText {} in Input, "differences", counting set_text, compares nothing;
    /// Every line of the recorded texts, made wrong in each way that docs/reference.md, "Scene files", excludes, and at the
    /// edge of what it admits: texts that are refused or read otherwise, or blamed at another place.
    RefuseText {} in Input, "differences", counting refuse_text, compares nothing;
    /// Every unit through the text of a scene, against its definition: error in ulp, and where the unit is in use with fewer
    /// digits, in half units of the last.
    Units {} in Input, "ulp", by every_unit, compares (| Elsewhere);
    /// Random problems and scenes as a peer reads them: fields that are missing, or that say another number.
    Wire {
        /// How many.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        problems: usize,
    } in CrossCode, "differences", counting wire, compares nothing;
    /// Random answers of a peer: numbers that are read otherwise, and differences between two answers other than those put in.
    WireAnswer {
        /// How many.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        problems: usize,
    } in CrossCode, "differences", counting wire_answer, compares nothing;
}

/// A group of the numbers of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Numbers {
    /// Those that the text states, in SI units, and the dimensionless groups.
    Scene,
    /// Coefficients and ends of the stages, and the exit depth.
    Stages,
    /// Outcome, end, margin and events of the flight by the claim's method.
    Flight,
    /// Critical velocity and energies, by the claim's method.
    Critical,
}

impl Numbers {
    /// The group that the number `name` belongs to.
    fn of(name: &str) -> Self {
        const STAGES: [&str; 4] = ["crater_stiffness_n_m", "static_force_n", "drag_kg_m", "exit_depth_m"];
        match name.strip_prefix("scene.") {
            Some(rest) if rest.starts_with("stages.") || STAGES.contains(&rest) => Self::Stages,
            Some(_) => Self::Scene,
            None if name.starts_with("groups.") && name != "groups.X_over_d" => Self::Scene,
            None if name.starts_with("critical_") || name.starts_with("eq15.") || name == "dimensionless_energy" => {
                Self::Critical
            }
            None => Self::Flight,
        }
    }
}

fn texts() -> Found<&'static [RecordedScene]> {
    recorded::scenes().map_err(NotMeasured::broken)
}

fn broken(text: &RecordedScene, why: &str) -> NotMeasured {
    NotMeasured::broken(format!("`{}`: {why}", text.name))
}

/// The text; that of the file for a scene that ships.
fn text_of(text: &RecordedScene) -> Found<&str> {
    let shipped = || SHIPPED.iter().find(|(name, _)| *name == text.name).map(|(_, text)| *text);
    text.text.as_deref().or_else(shipped).ok_or_else(|| broken(text, "there is no text"))
}

fn scene_of(text: &RecordedScene) -> Found<Scene> {
    Scene::from_toml(text_of(text)?, &text.name).map_err(|error| broken(text, &error.to_string()))
}

/// Takes the errors of what is `said` beside what is recorded of that group. A name that says nothing is NaN, and a
/// coefficient that is not recorded is zero.
fn compare(text: &RecordedScene, group: Numbers, said: &BTreeMap<String, f64>, worst: &mut Worst) -> Found<()> {
    let nothing = String::from("0");
    let zeros = said.keys().filter(|name| name.starts_with("scene.stages.")).map(|name| (name, &nothing));
    let recorded = text.numbers.iter().filter(|(name, _)| Numbers::of(name) == group);
    for (name, decimal) in zeros.filter(|(name, _)| !text.numbers.contains_key(*name)).chain(recorded) {
        let exact: f64 = decimal.parse().map_err(|_| broken(text, name))?;
        let condition = match (group, text.condition.get(name)) {
            (Numbers::Scene | Numbers::Stages, _) => 1.0,
            (_, None) => 10.0,
            (_, Some(condition)) => condition.parse().map_err(|_| broken(text, name))?,
        };
        let value = said.get(name).copied().unwrap_or(f64::NAN);
        let error = if value == exact { 0.0 } else { (value - exact).abs() / (exact.abs() * f64::EPSILON) };
        worst.take(error / condition, || format!("{name} of `{}`: {value:e}, exact {decimal}", text.name));
    }
    Ok(())
}

/// The largest difference, and how many texts it was sought in.
fn exact_text(&ExactText { numbers: group, own_laws }: &ExactText, subject: &Subject<'_>) -> Found {
    let method = build(subject.method_name(), &MethodOptions::default())?;
    let (mut worst, mut count, texts) = (Worst::default(), 0, texts()?);
    for text in texts {
        let scene = scene_of(text)?;
        let title = text.words.get("scene.title");
        holds!(scene.title.as_ref() == title, "`{}` is titled {:?}", text.name, scene.title);
        let has_laws = || scene.problem().is_ok_and(|problem| !problem.laws.is_empty());
        if own_laws.is_some_and(|wanted| wanted != has_laws()) {
            continue;
        }
        let said = match group {
            Numbers::Scene => Some(stated(&scene)),
            Numbers::Stages => scene.velocity.map(|speed| stages(text, &scene, speed)).transpose()?,
            Numbers::Flight => flight(text, &scene, &method)?,
            Numbers::Critical => critical(text, &scene, &method)?,
        };
        if let Some(said) = said {
            compare(text, group, &said, &mut worst)?;
            count += 1;
        }
    }
    let place = if worst.place.is_empty() { "none".to_owned() } else { worst.place };
    Ok(Measurement::new(worst.value)
        .resolving(0.5)
        .remark(format!("{count} of {} texts; worst {place}", texts.len()))
        .cases(count))
}

/// The numbers that a scene states, and its groups.
fn stated(scene: &Scene) -> BTreeMap<String, f64> {
    let mut said = BTreeMap::new();
    for (name, parameter) in [
        ("mass_kg", Parameter::Mass),
        ("diameter_m", Parameter::Diameter),
        ("nose_factor", Parameter::NoseFactor),
        ("strength_pa", Parameter::Strength),
        ("density_kg_m3", Parameter::Density),
        ("S", Parameter::StaticFactor),
        ("B", Parameter::InertiaFactor),
        ("k", Parameter::CraterRatio),
        ("velocity_m_s", Parameter::Velocity),
    ] {
        said.extend(parameter.get(scene).ok().map(|value| (format!("scene.{name}"), value)));
    }
    said.extend(scene.thickness.map(|thickness| ("scene.thickness_m".to_owned(), thickness)));
    if let Some(groups) = Groups::of(scene, scene.velocity.unwrap_or(0.0)) {
        said.insert("groups.I".to_owned(), groups.impact);
        said.extend(groups.geometry.map(|geometry| ("groups.N".to_owned(), geometry)));
        said.extend(groups.mass_ratio.map(|ratio| ("groups.N_without_nose".to_owned(), ratio)));
        said.insert("groups.X_over_d_eq11_12".to_owned(), groups.depth_ratio_eq11_12);
        said.insert("groups.johnson".to_owned(), groups.johnson);
        said.extend(groups.thickness_ratio.map(|ratio| ("groups.H_over_d".to_owned(), ratio)));
    }
    said
}

/// What the scene resolves into.
fn stages(text: &RecordedScene, scene: &Scene, speed: f64) -> Found<BTreeMap<String, f64>> {
    // A plug makes laws of the stages, whose coefficients are those without it.
    let plain = scene.plug.map(|_| scene.judged_by(Criterion::FullDepth));
    let problem = plain.as_ref().unwrap_or(scene).resolve(speed).map_err(|error| broken(text, &error.to_string()))?;
    let mut said = BTreeMap::from([("scene.exit_depth_m".to_owned(), problem.exit_depth)]);
    for (index, stage) in problem.stages.iter().enumerate() {
        let Stage { static_force, stiffness, viscosity, drag, end } = *stage;
        if end.is_finite() {
            said.insert(format!("scene.stages.{index}.end_m"), end);
        }
        if problem.laws.of(index).is_some() {
            continue;
        }
        for (name, value) in [
            ("static_force_n", static_force),
            ("stiffness_n_m", stiffness),
            ("viscosity_kg_s", viscosity),
            ("drag_kg_m", drag),
        ] {
            said.insert(format!("scene.stages.{index}.{name}"), value);
        }
    }
    let given = || Parameter::CraterStiffness.get(scene).ok();
    let crater = problem.crater.map(|crater| problem.stages[crater].stiffness).or_else(given);
    said.extend(crater.map(|stiffness| ("scene.crater_stiffness_n_m".to_owned(), stiffness)));
    if let Some(law) = scene.tunnel() {
        said.insert("scene.static_force_n".to_owned(), law.static_force);
        said.insert("scene.drag_kg_m".to_owned(), law.drag);
    }
    Ok(said)
}

/// The flight of the scene; `None` where it has no impact, or the method does not solve it.
fn flight(text: &RecordedScene, scene: &Scene, method: &Method) -> Found<Option<BTreeMap<String, f64>>> {
    let Some(speed) = scene.velocity else { return Ok(None) };
    let problem = scene.resolve(speed).map_err(|error| broken(text, &error.to_string()))?;
    let flight = match method.integrator().solve(&problem, Detail::Events) {
        Ok(flight) => flight,
        Err(refusal) if refusal.is_usage() => return Ok(None),
        Err(failure) => return Err(broken(text, &failure.to_string())),
    };
    let events = |index: usize| text.words.get(&format!("events.{index}.event"));
    let recorded: Vec<_> = (0..).map_while(events).map(String::as_str).collect();
    let Flight { outcome, end, .. } = flight;
    let listed: Vec<_> = flight.events.iter().map(|event| event.kind.name()).collect();
    holds!(text.words.get("outcome").is_some_and(|is| is == outcome.name()), "`{}` is {outcome}", text.name);
    holds!(recorded == listed, "`{}` has the events {}", text.name, listed.join(", "));
    let last = flight.events.last().map(|event| event.state);
    holds!(last == Some(end), "the last event of `{}` is {last:?}, the end {end:?}", text.name);
    let mut said = BTreeMap::new();
    let state = |prefix: &str, of: State| {
        [("time_s", of.time), ("depth_m", of.depth), ("velocity_m_s", of.velocity)]
            .map(|(name, value)| (format!("{prefix}{name}"), value))
    };
    said.extend(state("", end));
    said.insert("stage".to_owned(), flight.stage as f64);
    said.extend(flight.exit_margin.map(|margin| ("exit_margin".to_owned(), margin)));
    said.extend(Parameter::Diameter.get(scene).ok().map(|d| ("groups.X_over_d".to_owned(), end.depth / d)));
    for (index, event) in flight.events.iter().enumerate() {
        said.extend(state(&format!("events.{index}."), event.state));
        if let EventKind::StageEnd(stage) = event.kind {
            said.insert(format!("events.{index}.stage"), stage as f64);
        }
    }
    Ok(Some(said))
}

/// Critical velocity and energies; `None` without a far side, or where the method does not solve it.
fn critical(text: &RecordedScene, scene: &Scene, method: &Method) -> Found<Option<BTreeMap<String, f64>>> {
    let Some(thickness) = scene.thickness else { return Ok(None) };
    let found = match critical_velocity::of_scene(scene, method.integrator()) {
        Ok(found) => found,
        Err(refusal) if refusal.is_usage() => return Ok(None),
        Err(failure) => return Err(broken(text, &failure.to_string())),
    };
    let mut said = BTreeMap::from([
        ("critical_velocity_m_s".to_owned(), found.velocity),
        ("critical_energy_j".to_owned(), found.energy),
    ]);
    if let Some(concrete) = scene.concrete().filter(|concrete| concrete.layers.is_empty()) {
        let ratio = thickness / concrete.diameter;
        said.insert("dimensionless_energy".to_owned(), groups::dimensionless_energy(found.energy, concrete));
        said.insert("eq15.printed".to_owned(), concrete.static_factor * eq15_printed(ratio));
        said.insert("eq15.unrounded".to_owned(), concrete.static_factor * eq15_unrounded(ratio));
    }
    Ok(Some(said))
}

/// Decimal in `unit` whose SI value is `value` exactly; none within three ulp where the unit's value is rounded.
fn in_unit(value: f64, unit: &str, dimension: Dimension) -> Option<String> {
    let near = value / dimension.coefficient(unit)?;
    let steps = |from: f64, to: fn(f64) -> f64| std::iter::successors(Some(from), move |at| Some(to(*at))).take(4);
    let texts = steps(near, f64::next_up).chain(steps(near, f64::next_down)).map(|number| format!("{number:e} {unit}"));
    texts.into_iter().find(|text| units::quantity(text, dimension) == Ok(value))
}

fn set_text(_: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    for (turn, text) in texts()?.iter().enumerate() {
        let (name, file) = (&text.name, text_of(text)?);
        let read = |settings: &[String]| {
            SceneFile::from_toml(file, name, settings).map_err(|error| broken(text, &format!("{settings:?}: {error}")))
        };
        let SceneFile { scene, written } = read(&[])?;
        let given = written.numbers;
        // Two speeds: with a continuous crater constant the problem depends on it.
        let speed = scene.velocity.unwrap_or(123.0);
        let problem = |scene: &Scene| scene.resolve(scene.velocity.unwrap_or(speed)).ok();
        for (parameter, quantity) in &given {
            // S of all layers is no number of a scene of layers; each has its own.
            let is_back = parameter.get(&scene).map_or(true, |value| value == quantity.value);
            seen.expect(is_back, || format!("{parameter} of `{name}` reads back as another number"));
        }
        for (index, parameter) in Parameter::all_of(&scene).into_iter().enumerate() {
            let Ok(value) = parameter.get(&scene) else { continue };
            // A stated S is positive; zero is what Eq. 14 leaves to an air gap.
            if value == 0.0 && parameter.key() == "S" {
                continue;
            }
            let mut forms = vec![format!("{value:e}")];
            if let Some(dimension) = parameter.entry().dimension {
                let common = dimension.units();
                forms.extend(in_unit(value, common[(turn + index) % common.len()], dimension));
            }
            for form in forms {
                let place = || format!("{parameter} = {form} in `{name}`");
                let set = read(&[format!("{parameter}={form}")])?.scene;
                let is_back = parameter.parse_value(&form) == Ok(value) && parameter.get(&set) == Ok(value);
                seen.expect(is_back, || format!("{} reads back as another number", place()));
                seen.expect(problem(&set) == problem(&scene), || format!("{} is another problem", place()));
            }
            moved(text, &scene, parameter, value, &read, seen)?;
        }
        grouped(text, &scene, seen)?;
    }
    Ok(())
}

/// Another value, set in the text and set in the scene: the same problem, and another than before.
fn moved(
    text: &RecordedScene,
    scene: &Scene,
    parameter: Parameter,
    value: f64,
    read: &impl Fn(&[String]) -> Found<SceneFile>,
    seen: &mut Violations,
) -> Found<()> {
    // Less is in the range of every number, apart from the end of a stage in front of another, and more of the others.
    let factor = if matches!(parameter, Parameter::Stage(..)) { 1.0 + 1.0 / 1024.0 } else { 0.875 };
    let other = value * factor;
    let (in_text, mut in_scene) = (read(&[format!("{parameter}={other:e}")])?.scene, scene.clone());
    parameter.set(&mut in_scene, other).map_err(|error| broken(text, &error.to_string()))?;
    let solved = |scene: &Scene| scene.resolve(scene.velocity.unwrap_or(123.0)).ok();
    let place = format!("{parameter} = {other:e} of `{}`", text.name);
    let is_one = solved(&in_text) == solved(&in_scene);
    seen.expect(is_one, || format!("{place} gives one problem in the text and another in the scene"));
    let is_back = parameter.get(&in_scene) == Ok(other) && parameter.get(&in_text) == Ok(other);
    seen.expect(is_back, || format!("{place} reads back as another number"));
    // A stated S stays, whatever the strength.
    let strength = match parameter {
        Parameter::StaticFactor => Some(Parameter::Strength),
        Parameter::Layer(layer, LayerNumber::StaticFactor) => Some(Parameter::Layer(layer, LayerNumber::Strength)),
        _ => None,
    };
    if let Some(strength) = strength {
        for mut scene in [in_scene.clone(), in_text.clone()] {
            let set = strength.get(&scene).and_then(|of| strength.set(&mut scene, 0.75 * of));
            seen.expect(set.is_ok() && parameter.get(&scene) == Ok(other), || format!("{place} follows the strength"));
        }
    }
    let without = scene.concrete().is_some_and(|c| {
        let no_crater = c.crater_ratio == 0.0 && matches!(parameter, Parameter::CraterStiffness);
        let no_drag = c.density * c.nose_factor * c.inertia_factor == 0.0;
        let of_drag = [Parameter::NoseFactor, Parameter::InertiaFactor, Parameter::Density].contains(&parameter);
        // A layer in front of k d leaves no trace but its thickness.
        no_crater || (no_drag && of_drag) || matches!(parameter, Parameter::Layer(..))
    });
    // The end of the last stage is never crossed.
    let without = without || parameter == last_end(scene);
    let is_moved = value == 0.0 || without || solved(&in_scene) != solved(scene);
    seen.expect(is_moved, || format!("{place} changes nothing"));
    Ok(())
}

/// The end of the last stage, which the problem does not have.
fn last_end(scene: &Scene) -> Parameter {
    let count = if let Resistance::Stages(stages) = &scene.resistance { stages.len() } else { 0 };
    Parameter::Stage(count.saturating_sub(1), StageNumber::End)
}

/// I, N and H/d as recorded, each set in the scene with another speed, density and thickness: those of the scene come back.
fn grouped(text: &RecordedScene, scene: &Scene, seen: &mut Violations) -> Found<()> {
    for (name, group) in [("I", Parameter::Impact), ("N", Parameter::Geometry), ("H_over_d", Parameter::ThicknessRatio)]
    {
        let recorded = text.numbers.get(&format!("groups.{name}")).and_then(|decimal| decimal.parse::<f64>().ok());
        let of = |name: &str| text.numbers.get(name).and_then(|decimal| decimal.parse::<f64>().ok());
        let (density, strength) = (of("scene.density_kg_m3"), of("scene.strength_pa"));
        if let (Some(density), Some(strength), Some(speed)) = (density, strength, scene.velocity) {
            let johnson = Groups::of(scene, speed).map_or(f64::NAN, |groups| groups.johnson);
            let is_right = (johnson - density * speed * speed / strength).abs() <= 1e-15 * johnson;
            seen.expect(is_right, || format!("Johnson's number of `{}` is {johnson:e}", text.name));
        }
        let (Some(recorded), Ok(value)) = (recorded, group.moves().get(scene)) else { continue };
        let mut other = scene.clone();
        let set = group.moves().set(&mut other, 1.7 * value).and_then(|()| group.set(&mut other, recorded));
        let back = set.and_then(|()| Ok((group.moves().get(&other)?, group.get(&other)?)));
        let (value_back, group_back) = back.map_err(|error| broken(text, &error.to_string()))?;
        let near = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs();
        let is_back = near(value_back, value) && near(group_back, recorded);
        seen.expect(is_back, || format!("{name} = {recorded} of `{}` sets {value_back:e} for {value:e}", text.name));
    }
    Ok(())
}

/// What docs/reference.md says of a key that holds a number.
struct Key {
    /// Whether a scene that leaves it out is none.
    is_required: bool,
    /// Whether it may be negative, and whether it may be zero.
    negative: bool,
    zero: bool,
}

/// The rule for `key` of the table `header`.
fn rule_of(header: &str, key: &str) -> Option<Key> {
    let is_layer = header == "[[target.layer]]";
    // Names of the file's own, which may be those of keys.
    if header == "[parameters]" {
        return None;
    }
    let (is_required, negative, zero) = match key {
        "mass" | "diameter" => (true, false, false),
        "strength" => (true, false, is_layer),
        "density" | "velocity" => (true, false, true),
        "S" | "crater_stiffness" => (false, false, false),
        "B" | "k" | "viscosity" | "stiffness" | "drag" => (false, false, true),
        "thickness" if !is_layer => (false, false, true),
        "static_force" => (false, true, true),
        _ => return None,
    };
    Some(Key { is_required, negative, zero })
}

/// Texts in which a key is made wrong.
const TEXTS_FOR_A_KEY: usize = 5;

fn refuse_text(_: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let mut tried = BTreeMap::<_, usize>::new();
    for text in texts()? {
        let (lines, name) = (text_of(text)?.lines().collect::<Vec<_>>(), &text.name);
        let mut header = "";
        for (at, line) in lines.iter().enumerate() {
            if line.starts_with('[') {
                header = line;
            }
            let Some((key, value)) = line.split_once(" = ").filter(|(key, _)| !key.starts_with('#')) else { continue };
            // A nose by what stands in front of its number.
            let kind = if key == "nose" { value.rsplit_once('=').map_or(value, |(shape, _)| shape) } else { key };
            let count = tried.entry((header, kind)).or_default();
            *count += 1;
            if *count > TEXTS_FOR_A_KEY {
                continue;
            }
            // The scene with `new` in place of the line is read where `is_read`, else refused at that line.
            let mut expect = |new: &str, is_read: bool, has_place: bool| {
                let mut changed = lines.clone();
                changed[at] = new;
                let read = Scene::from_toml(&changed.join("\n"), name);
                let place = read.as_ref().err().and_then(|error| error.place.as_ref());
                let is_there = place.is_some_and(|place| {
                    let underlined = changed.join("\n").get(place.span.clone()).map(str::to_owned);
                    place.line == at + 1 && underlined.is_some_and(|part| !part.is_empty() && new.contains(&part))
                });
                seen.expect(read.is_ok() == is_read, || format!("`{new}` in `{name}`: {:?}", read.as_ref().err()));
                seen.expect(is_read || !has_place || is_there, || {
                    format!("`{new}` in `{name}` is blamed at {place:?}")
                });
            };
            if key == "nose" {
                nose_ranges(value, |new, is_read| expect(&format!("nose = {new}"), is_read, true));
            }
            let Some(rule) = rule_of(header, key) else { continue };
            expect(&format!("{key} = -3"), rule.negative, true);
            expect(&format!("{key} = -0.0"), rule.zero, true);
            expect(&format!("{key} = 0"), rule.zero, true);
            for wrong in
                ["nan", "inf", "1e999", "true", "'three'", "'3 J'", "'3 furlong'", "[3]", "{ a = 3 }", "'1,5 mm'"]
            {
                expect(&format!("{key} = {wrong}"), false, true);
            }
            expect(&format!("{key}s = {value}"), false, true);
            expect(&format!("{key} = {value}\n{key} = {value}"), false, false);
            // A last stage that ends at the far side needs one.
            if key != "thickness" {
                expect("", !rule.is_required, false);
            }
            expect(&format!("{key} = {value} # of the scene"), true, true);
        }
    }
    Ok(())
}

/// The edges of the range of the number in a nose, each with whether it is admitted.
fn nose_ranges(nose: &str, mut expect: impl FnMut(&str, bool)) {
    let Some((shape, number)) = nose.trim_end_matches([' ', '}']).rsplit_once(" = ") else { return };
    let edges: &[(&str, bool)] = if number.parse::<f64>().is_err() {
        &[("'round'", false), ("3", false), ("'flat', factor = 0.7", false), ("'flat', radius_ratio = 0.7", false)]
    } else if shape.ends_with("tip_ratio") {
        &[("0", true), ("1", true), ("-0.001", false), ("1.001", false), ("inf", false)]
    } else if shape.ends_with("factor") {
        &[("0", true), ("1", true), ("-0.001", false), ("1.001", false), ("nan", false)]
    } else if shape.ends_with("length_ratio") {
        &[("0.001", true), ("0", false), ("-1", false), ("inf", false)]
    } else {
        &[("0.5", true), ("0.499", false), ("'0.7 m'", false), ("nan", false)]
    };
    for (edge, is_read) in edges {
        expect(&format!("{shape} = {edge} }}"), *is_read);
    }
}

/// `verification/references/units.json`: dimension, digits that the unit is in use with, SI value, spellings.
type UnitRecord = Vec<(String, u8, String, Vec<String>)>;

/// Where a scene states a quantity of the dimension; the rest of it.
fn holder(dimension: Dimension) -> Option<(Parameter, &'static str)> {
    const STAGE: &str = "projectile.mass = 3\n[[stage]]\n";
    const TARGET: &str = "projectile = { mass = 3, diameter = 5, nose.factor = 0.25 }\n[target]\n";
    Some(match dimension {
        Dimension::Mass => (Parameter::Mass, "stage = [{}]\n[projectile]\n"),
        Dimension::Length => {
            (Parameter::Diameter, "[target]\nstrength = 7\ndensity = 3\n[projectile]\nmass = 1\nnose.factor = 1\n")
        }
        Dimension::Pressure => (Parameter::Strength, TARGET),
        Dimension::Density => (Parameter::Density, TARGET),
        Dimension::Velocity => (Parameter::Velocity, "projectile.mass = 3\nstage = [{}]\n[impact]\n"),
        Dimension::Force => (Parameter::Stage(0, StageNumber::StaticForce), STAGE),
        Dimension::Stiffness => (Parameter::Stage(0, StageNumber::Stiffness), STAGE),
        Dimension::Viscosity => (Parameter::Stage(0, StageNumber::Viscosity), STAGE),
        Dimension::Drag => (Parameter::Stage(0, StageNumber::Drag), STAGE),
        Dimension::Time | Dimension::Energy => return None,
    })
}

fn every_unit(_: &Subject<'_>) -> Found {
    let record: UnitRecord = serde_json::from_str(include_str!("../../../verification/references/units.json"))
        .map_err(|error| NotMeasured::broken(format!("units.json: {error}")))?;
    let (mut worst, mut count) = (Worst::default(), 0);
    for (name, digits, decimal, spellings) in &record {
        let known = Dimension::VARIANTS.iter().find(|dimension| <&str>::from(**dimension) == name);
        let dimension = *known.ok_or_else(|| NotMeasured::broken(format!("no dimension {name}")))?;
        let exact: f64 = decimal.parse().map_err(|_| NotMeasured::broken(decimal.clone()))?;
        for unit in spellings {
            let value = through_text(dimension, unit).unwrap_or(f64::NAN);
            // Half a unit of the last digit is at most five units of the digit behind it, of the value.
            let digit = if *digits < 17 { 5.0 / 10_f64.powi(i32::from(*digits)) } else { f64::EPSILON };
            let error = if value == exact { 0.0 } else { (value / exact - 1.0).abs() / digit };
            worst.take(error, || format!("1 {unit} = {value:e}, exact {decimal}"));
            count += 1;
        }
    }
    for (dimension, unit) in Dimension::spellings() {
        let is_recorded = record
            .iter()
            .any(|(name, _, _, names)| *name == <&str>::from(dimension) && names.iter().any(|n| n == unit));
        holds!(is_recorded, "the unit `{unit}` is not recorded: `python3 verification/references/exact.py`");
    }
    let remark = format!("{count} spellings; worst {}", worst.place);
    Ok(Measurement::new(worst.value).resolving(0.5).remark(remark).cases(count))
}

/// SI value of `1 unit`, as the text of a scene has it; of times and energies, which no scene holds, as an option has it.
fn through_text(dimension: Dimension, unit: &str) -> Option<f64> {
    let Some((parameter, rest)) = holder(dimension) else {
        return units::quantity(&format!("1 {unit}"), dimension).ok();
    };
    let mut text = format!("{rest}{} = '''1 {unit}'''\n", parameter.key());
    for (key, other) in [("strength", Dimension::Pressure), ("density", Dimension::Density)] {
        let both = [Dimension::Pressure, Dimension::Density].contains(&dimension);
        if both && other != dimension {
            text.push_str(&format!("{key} = 7\n"));
        }
    }
    parameter.get(&Scene::from_toml(&text, unit).ok()?).ok()
}

/// Fields of a question, the id apart, which is that of the line.
const FIELDS: usize = 8;

fn wire(&Wire { problems }: &Wire, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let mut random = subject.random("wire");
    for index in 0..problems {
        let (problem, rtol) = (of_many_stages(&mut random), random.log_uniform(1e-14, 1e-3));
        let line = serde_json::to_string(&PeerRequest::from_problem(&problem, rtol));
        let line = line.map_err(|error| NotMeasured::broken(error.to_string()))?;
        let question: Value = serde_json::from_str(&line).map_err(|error| NotMeasured::broken(error.to_string()))?;
        // Field by field, by the names of docs/reference.md, "Peer protocol".
        let ends = problem.stages.iter().map(|stage| stage.end).chain([problem.exit_depth]);
        let first = ends.fold(f64::INFINITY, f64::min);
        let mut fields = vec![
            ("/mass_kg".to_owned(), problem.mass),
            ("/velocity_m_s".to_owned(), problem.impact_speed),
            ("/exit_depth_m".to_owned(), problem.exit_depth),
            ("/rtol".to_owned(), rtol),
            ("/atol/0".to_owned(), rtol * first),
            ("/atol/1".to_owned(), rtol * problem.impact_speed),
            ("/repeats".to_owned(), 1.0),
        ];
        for (stage, law) in problem.stages.iter().enumerate() {
            fields.extend(
                [
                    ("static_force_n", law.static_force),
                    ("stiffness_n_m", law.stiffness),
                    ("viscosity_kg_s", law.viscosity),
                    ("drag_kg_m", law.drag),
                    ("end_m", law.end),
                ]
                .map(|(name, value)| (format!("/stages/{stage}/{name}"), value)),
            );
        }
        for (path, value) in &fields {
            let said = question.pointer(path);
            let is_right = match said {
                Some(Value::Null) => *value == f64::INFINITY,
                Some(number) => number.as_f64() == Some(*value),
                None => false,
            };
            seen.expect(is_right, || format!("{path} is {said:?} for {value:e} in problem {index}"));
        }
        let is_all = question.as_object().is_some_and(|fields| fields.len() == FIELDS)
            && question["scene"].is_null()
            && question["stages"].as_array().is_some_and(|all| all.len() == problem.stages.len());
        seen.expect(is_all, || format!("problem {index} has other fields: {line}"));
        let back: Option<PeerRequest> = serde_json::from_str(&line).ok();
        let is_same = back.is_some_and(|request| request.problem(problem.crater) == problem);
        seen.expect(is_same, || format!("problem {index} reads back as another"));
    }
    let mut generator = Generator::new(subject.context.seed, "wire of scenes");
    for index in 0..problems {
        let mut scene = generator.next_scene();
        scene.criterion = if random.chance(0.5) { Criterion::Ndrc } else { Criterion::FullDepth };
        if let Resistance::Concrete(concrete) = &mut scene.resistance {
            concrete.inertia_factor = random.uniform(0.5, 1.5);
            concrete.follows_eq14 = random.chance(0.5);
        }
        let asked =
            serde_json::to_value(PeerScene::of(&scene)).map_err(|error| NotMeasured::broken(error.to_string()))?;
        let expected = told_of(&scene).ok_or_else(|| NotMeasured::broken("a random scene is one of concrete"))?;
        seen.expect(asked == expected, || format!("scene {index} is asked as {asked}, and is {expected}"));
    }
    Ok(())
}

/// What a peer gets of `scene`, by the names of docs/reference.md, "Peer protocol".
fn told_of(scene: &Scene) -> Option<Value> {
    let concrete = scene.concrete()?;
    let stiffness = match concrete.crater_stiffness {
        CraterStiffness::Given(stiffness) => Some(stiffness),
        CraterStiffness::Continuous => None,
    };
    Some(json!({
        "mass_kg": scene.mass,
        "diameter_m": concrete.diameter,
        "nose_factor": concrete.nose_factor,
        "strength_pa": concrete.strength,
        "density_kg_m3": concrete.density,
        "thickness_m": scene.thickness,
        "S": if concrete.follows_eq14 { None } else { Some(concrete.static_factor) },
        "B": concrete.inertia_factor,
        "k": concrete.crater_ratio,
        "crater_stiffness_n_m": stiffness,
        "velocity_m_s": scene.velocity,
        "criterion": if scene.criterion == Criterion::Ndrc { "ndrc" } else { "full-depth" },
    }))
}

/// One to five stages with every term, all numbers different; an exit in three of four.
fn of_many_stages(random: &mut Random) -> Problem {
    let (count, mut end) = (1 + random.below(5), 0.0);
    let mut stages = Vec::with_capacity(count);
    for index in 0..count {
        end += random.log_uniform(0.01, 1.0);
        stages.push(Stage {
            static_force: random.log_uniform(1.0, 1e7) * if random.chance(0.2) { -1.0 } else { 1.0 },
            stiffness: random.log_uniform(1.0, 1e8),
            viscosity: random.log_uniform(0.1, 1e4),
            drag: random.log_uniform(0.01, 100.0),
            end: if index + 1 == count { f64::INFINITY } else { end },
        });
    }
    let problem = Problem::of_stages(random.log_uniform(0.01, 100.0), random.log_uniform(1.0, 1000.0), stages);
    if count == 1 || random.chance(0.75) { problem.with_exit(random.log_uniform(0.05, 2.0) * end) } else { problem }
}

/// The state `of` in an answer.
fn fields(mut of: Value, state: State) -> Value {
    of["time_s"] = json!(state.time);
    of["depth_m"] = json!(state.depth);
    of["velocity_m_s"] = json!(state.velocity);
    of
}

fn wire_answer(&WireAnswer { problems }: &WireAnswer, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let mut random = subject.random("wire-answer");
    for index in 0..problems {
        let mut problem = of_many_stages(&mut random);
        problem.crater = Some(0).filter(|_| random.chance(0.5) && problem.stages.len() > 1);
        let (rests, speed) = (random.chance(0.5), problem.impact_speed);
        let mut state = |depth: f64| State {
            time: random.log_uniform(1e-6, 1.0),
            depth,
            velocity: speed * random.log_uniform(1e-3, 2.0),
        };
        let mut places: Vec<_> = problem.stages.iter().map(|stage| stage.end).filter(|end| end.is_finite()).collect();
        places.push(2.0 * places.last().copied().unwrap_or(0.3));
        let mut states: Vec<_> = places.into_iter().map(&mut state).collect();
        if rests && let Some(last) = states.last_mut() {
            last.velocity = 0.0;
        }
        let end = states[states.len() - 1];
        let answer = |states: &[State]| {
            let event = |(stage, state): (usize, &State)| {
                let is_last = stage + 1 == states.len();
                let name = if !is_last {
                    "stage-end"
                } else if rests {
                    "rest"
                } else {
                    "exit"
                };
                let event = if is_last { json!({"event": name}) } else { json!({"event": name, "stage": stage}) };
                fields(event, *state)
            };
            let outcome = if rests { "stopped" } else { "perforated" };
            let events: Vec<_> = states.iter().enumerate().map(event).collect();
            let whole = json!({"outcome": outcome, "events": events, "force_evaluations": 17 + index, "wall_ns": 2.5,
                "wall_ns_quartiles": [1.25, 3.75]});
            let line = fields(whole, states[states.len() - 1]).to_string();
            serde_json::from_str::<PeerAnswer>(&line).map_err(|error| NotMeasured::broken(error.to_string()))
        };
        let read = answer(&states)?;
        let flight = read.flight(&problem);
        let listed: Vec<_> = flight.events.iter().map(|event| event.state).collect();
        let kinds = flight.events.iter().enumerate().all(|(at, event)| match event.kind {
            EventKind::CraterEnd => problem.crater == Some(at) && at + 1 < states.len(),
            EventKind::StageEnd(stage) => problem.crater != Some(at) && stage == at && at + 1 < states.len(),
            EventKind::Plug => false,
            EventKind::Rest => rests && at + 1 == states.len(),
            EventKind::Exit => !rests && at + 1 == states.len(),
        });
        let is_outcome = flight.outcome.name() == if rests { "stopped" } else { "perforated" };
        let is_read = flight.end == end && listed == states && kinds && is_outcome;
        seen.expect(is_read, || format!("answer {index} is read as {flight:?}"));
        let costs = (read.force_evaluations, read.wall_ns, read.wall_ns_quartiles);
        let is_cost = costs == (Some(17 + index as u64), Some(2.5), Some([1.25, 3.75]));
        seen.expect(is_cost && flight.cost.force_evaluations == 17 + index as u64, || format!("{costs:?}"));
        // Each number moved by a share of its own.
        let mut shares = Vec::new();
        let mut moved = states.clone();
        for state in &mut moved {
            let share = [(); 3].map(|()| random.log_uniform(1e-3, 1e-2) * if random.chance(0.5) { 1.0 } else { -1.0 });
            state.time *= 1.0 + share[0];
            state.depth *= 1.0 + share[1];
            state.velocity *= 1.0 + share[2];
            shares.push(share);
        }
        let differences = answer(&moved)?.differences_from(&flight, &problem);
        let differences = differences.ok_or_else(|| NotMeasured::broken("answers of one outcome are not compared"))?;
        // The end, and then each event.
        let rows = std::iter::once(states.len() - 1).chain(0..states.len());
        let expected = rows.flat_map(|at| {
            let (State { time, depth, velocity }, [of_time, of_depth, of_velocity]) = (states[at], shares[at]);
            let stage = problem.stages.iter().find(|stage| depth <= stage.end).unwrap_or(&problem.stages[0]);
            // V0/V at a place that is passed; at rest V0 over the speed lost in the whole time.
            let slowing = (stage.static_force + stage.stiffness * depth).abs() / problem.mass * time;
            let of_passing = if velocity > 0.0 { (speed / velocity).max(1.0) } else { 1.0 };
            let of_timing = if velocity > 0.0 { of_passing } else { (speed / slowing).max(1.0) };
            [(of_depth.abs(), 1.0), (of_time.abs(), of_timing), (of_velocity.abs() * velocity / speed, of_passing)]
        });
        let expected: Vec<_> = expected.collect();
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-10 * b.abs();
        let is_all = differences.len() == expected.len()
            && differences.iter().zip(&expected).all(|(found, (relative, conditioning))| {
                near(found.relative, *relative) && near(found.conditioning, *conditioning)
            });
        seen.expect(is_all, || format!("answer {index} differs by {differences:?} for {expected:?}"));
        // What names no outcome has that of its depth.
        let request = PeerRequest { exit_depth_m: Some(end.depth), ..PeerRequest::from_problem(&problem, 1e-9) };
        for (share, perforates) in [(0.5, false), (1.0 - 1e-6, false), (1.0 - 1e-10, true), (1.0, true), (1.2, true)] {
            let named = request.outcome_at(share * end.depth);
            let is_named = (named == Outcome::Perforated) == perforates;
            seen.expect(is_named, || format!("answer {index} at {share} of the exit depth is named {named:?}"));
        }
        let contrary = Flight { outcome: if rests { Outcome::Perforated } else { Outcome::Stopped }, ..flight };
        let is_refused = read.differences_from(&contrary, &problem).is_none();
        seen.expect(is_refused, || format!("answer {index} is compared with a contrary one"));
    }
    Ok(())
}
