//! Which JSON schema has a scene file, for editors? The tables, keys, units and ranges of the reader, as far as one value
//! alone decides: that the ends of stages rise, and that no number overflows, only the reader knows.

use serde_json::{Map, Value, json};

use super::{FORCE, LAYERED_TARGET, MATERIAL_OF_PROJECTILE, MATERIAL_OF_TARGET, NOSES, PLUG, UNTIL, below, numbers};
use crate::exchange::diagnostic::key_of;
use crate::physics::Range;
use crate::physics::parameter::{Absence, Entry, LayerNumber, Parameter, StageNumber};
use crate::physics::scene::Criterion;
use crate::physics::units::Dimension;
use strum::VariantNames;

/// The JSON schema (draft 7, which editors know best) of a scene file.
pub fn schema() -> Value {
    let mut schema = table("");
    let none_of = |paths: &[&str]| paths.iter().map(|path| (key_of(path).to_owned(), false.into())).collect();
    let absent = |paths: &[&str]| json!({ "properties": Value::Object(none_of(paths)) });
    let required = |paths: &[&str]| json!({ "required": paths.iter().map(|path| key_of(path)).collect::<Vec<_>>() });
    let stages = json!({ "properties": {
        "projectile": absent(&MATERIAL_OF_PROJECTILE),
        "target": absent(&MATERIAL_OF_TARGET),
        "resistance": false,
        "perforation": { "properties": {
            "criterion": { "const": <&str>::from(Criterion::FullDepth) },
            "half_angle": false,
            "shear_strength": false,
        } },
    } });
    let target = json!({
        "if": { "required": ["layer"] },
        "then": absent(&LAYERED_TARGET),
        "else": required(&MATERIAL_OF_TARGET[..2]),
    });
    let plug = json!({
        "if": { "properties": { "criterion": { "const": <&str>::from(Criterion::Plug) } }, "required": ["criterion"] },
        "then": { "required": PLUG.map(key_of) },
        "else": absent(&PLUG),
    });
    let concrete = json!({
        "required": ["target"],
        "properties": { "projectile": required(&MATERIAL_OF_PROJECTILE), "target": target, "perforation": plug, "parameters": false },
    });
    // Units of parameters are any product of known ones, which the reader alone knows.
    let parameter =
        json!({ "type": ["number", "string"], "description": "\"number unit\" of any unit, or a plain number" });
    schema["properties"]["parameters"] = json!({
        "type": "object",
        "description": "quantities that the forces of stages use by name",
        "additionalProperties": parameter,
    });
    for (key, value) in [
        ("$schema", json!("http://json-schema.org/draft-07/schema#")),
        ("title", json!("A scene of penetrode")),
        ("required", json!(["projectile"])),
        ("if", json!({ "required": ["stage"] })),
        ("then", stages),
        ("else", concrete),
        ("definitions", Value::Object(definitions())),
    ] {
        schema[key] = value;
    }
    schema
}

/// The table at `home`, entries of a list included.
fn table(home: &str) -> Value {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for rest in below(home) {
        let key = rest.split('.').next().unwrap_or(rest);
        let path = if home.is_empty() { key.to_owned() } else { format!("{home}.{key}") };
        let inner = rest.strip_prefix(key).unwrap_or_default();
        let schema = match path.as_str() {
            _ if properties.contains_key(key) => continue,
            "projectile.nose" => nose(),
            FORCE => force(),
            _ if inner.starts_with(".*") => {
                json!({ "type": "array", "minItems": 1, "items": table(&format!("{path}.*")) })
            }
            _ if !inner.is_empty() => table(&path),
            "perforation.criterion" => {
                json!({ "enum": Criterion::VARIANTS, "default": <&str>::from(Criterion::default()) })
            }
            _ => match numbers().find(|number| number.entry().path == path) {
                Some(number) => {
                    let is_material =
                        MATERIAL_OF_PROJECTILE.iter().chain(&MATERIAL_OF_TARGET).any(|known| *known == path);
                    // The last layer goes without a thickness.
                    let is_last = matches!(number, Parameter::Layer(_, LayerNumber::Thickness));
                    let is_of_plug = matches!(number, Parameter::HalfAngle | Parameter::ShearStrength);
                    let is_required = !is_material && !is_last && !is_of_plug;
                    if matches!(number.entry().absence, Absence::Refused(_)) && is_required {
                        required.push(key);
                    }
                    described(number)
                }
                None => json!({ "type": "string" }),
            },
        };
        properties.insert(key.to_owned(), schema);
    }
    let mut schema =
        json!({ "type": "object", "additionalProperties": false, "properties": properties, "required": required });
    if home == "stage.*" {
        let keys = StageNumber::ALL
            .into_iter()
            .filter(|which| which.is_coefficient())
            .map(|which| Parameter::Stage(0, which).key());
        let absent: Map<String, Value> = keys.map(|key| (key.to_owned(), false.into())).collect();
        schema["not"] = json!({ "required": [Parameter::Stage(0, StageNumber::EndVelocity).key(), key_of(UNTIL)] });
        schema["properties"][key_of(UNTIL)]["description"] =
            "the stage ends where two expressions of x and V are equal, such as V = v1 with v1 in [parameters]".into();
        schema["if"] = json!({ "required": ["force"] });
        schema["then"] = json!({ "properties": absent });
    }
    schema
}

/// The number, with what it is and what its absence means.
fn described(number: Parameter) -> Value {
    let Entry { name, absence, .. } = number.entry();
    let mut schema = value_of(number);
    let meaning = match absence {
        Absence::Means(what) => format!("; without it: {what}"),
        Absence::Refused(_) | Absence::Is(_) => String::new(),
    };
    schema["description"] = format!("{name}{meaning}").into();
    if let Absence::Is(default) = absence
        && default.is_finite()
    {
        schema["default"] = default.into();
    }
    schema
}

/// What a value of `number` looks like.
fn value_of(number: Parameter) -> Value {
    let Entry { dimension, range, .. } = number.entry();
    // S of a layer that a file gives is that of any concrete.
    let is_given = matches!(number, Parameter::Layer(_, LayerNumber::StaticFactor));
    let range = if is_given { Parameter::StaticFactor.entry().range } else { range };
    if number == Parameter::HalfAngle {
        let pattern = format!("^\\s*{}\\s*(?:deg|°)\\s*$", decimal(range));
        return json!({ "anyOf": [{ "type": "string", "pattern": pattern }, in_range(range)] });
    }
    let Some(dimension) = dimension else { return in_range(range) };
    let quantity = json!({ "$ref": format!("#/definitions/{}", name_of(dimension, range)) });
    let mut ways = vec![quantity];
    if number == Parameter::CraterStiffness {
        ways.push(json!({ "const": "continuous" }));
    }
    json!({ "anyOf": ways })
}

/// A bare number.
fn in_range(range: Range) -> Value {
    let (key, bound) = match range {
        Range::Finite => return json!({ "type": "number" }),
        Range::NotNegative => ("minimum", 0.0),
        Range::Positive => ("exclusiveMinimum", 0.0),
        Range::UnitInterval => return json!({ "type": "number", "minimum": 0, "maximum": 1 }),
        Range::AtLeastHalf => ("minimum", 0.5),
        Range::BelowRightAngle => return json!({ "type": "number", "minimum": 0, "exclusiveMaximum": 90 }),
    };
    json!({ "type": "number", key: bound })
}

/// The force of a stage, in place of its coefficients.
fn force() -> Value {
    let text = |what: &str| json!({ "type": "string", "description": what });
    let expression = text("F(x, V) in N, such as P + Q*V^2, with P and Q in [parameters]");
    let table = |over: &str, column: &str| {
        json!({
            "type": "object",
            "additionalProperties": false,
            "properties": {
                "table": text("CSV file, its path counted from the folder of the scene"),
                over: text(column),
                "force": text("column of forces, its unit last: force_kN"),
            },
            "required": ["table", over, "force"],
        })
    };
    let of_depth = table("x", "column of depths from the impact face, its unit last: depth_mm");
    let of_velocity = table("V", "column of velocities from 0 on, its unit last: speed_m_s");
    json!({ "anyOf": [expression, of_depth, of_velocity] })
}

/// The nose in one of its forms.
fn nose() -> Value {
    let form = |shape: Option<&str>, ratios: &[(&str, Range)]| {
        let shape = shape.map(|name| ("shape".to_owned(), json!({ "const": name })));
        let ratios = ratios.iter().map(|(key, range)| ((*key).to_owned(), in_range(*range)));
        let properties: Map<String, Value> = shape.into_iter().chain(ratios).collect();
        let required: Vec<_> = properties.keys().cloned().collect();
        json!({ "type": "object", "additionalProperties": false, "properties": properties, "required": required })
    };
    let factor = Parameter::NoseFactor;
    let shapes = NOSES.map(|(shape, ratios, _)| {
        let keys: Vec<_> = ratios.iter().map(|(path, range)| (key_of(path), *range)).collect();
        form(Some(shape), &keys)
    });
    let forms: Vec<_> = [form(None, &[(factor.key(), factor.entry().range)])].into_iter().chain(shapes).collect();
    json!({ "oneOf": forms })
}

fn name_of(dimension: Dimension, range: Range) -> String {
    format!("{dimension:?}{range:?}")
}

/// Each quantity that a scene has: a number with a unit, or a bare one.
fn definitions() -> Map<String, Value> {
    let quantity = |(dimension, range): (Dimension, Range)| {
        let pattern = format!("^\\s*{}\\s*(?:{})\\s*$", decimal(range), units(dimension));
        let text = json!({ "type": "string", "pattern": pattern });
        let known = dimension.units();
        let description = format!("\"number unit\", such as \"1 {}\"; a bare number is in {}", known[1], known[0]);
        (name_of(dimension, range), json!({ "description": description, "anyOf": [text, in_range(range)] }))
    };
    let of = |number: Parameter| number.entry().dimension.map(|dimension| (dimension, number.entry().range));
    numbers().filter_map(of).map(quantity).collect()
}

/// Pattern of a decimal within `range`, as far as its sign goes, and its being zero.
fn decimal(range: Range) -> &'static str {
    match range {
        Range::Finite => r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?",
        Range::Positive => r"\+?(?:[0-9]*[1-9][0-9]*\.?[0-9]*|[0-9]*\.[0-9]*[1-9][0-9]*)(?:[eE][+-]?[0-9]+)?",
        _ => r"(?:\+?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|-(?:0+\.?0*|\.0+)(?:[eE][+-]?[0-9]+)?)",
    }
}

/// Pattern of the units of `dimension`, in each spelling that is read.
fn units(dimension: Dimension) -> String {
    let mut pattern = String::new();
    for (_, unit) in Dimension::spellings().filter(|(of, _)| *of == dimension) {
        if !pattern.is_empty() {
            pattern.push('|');
        }
        for symbol in unit.chars() {
            match symbol {
                '²' => pattern.push_str("(?: ?\\^)?[2²]"),
                '³' => pattern.push_str("(?: ?\\^)?[3³]"),
                'µ' if ["µm", "µs"].contains(&unit) => pattern.push_str("[µμu]"),
                'µ' => pattern.push_str("[µμ]"),
                '/' => pattern.push_str("(?:/| / )"),
                ' ' => pattern.push_str("\\s+"),
                '(' | ')' | '*' | '.' => pattern.extend(['\\', symbol]),
                _ => pattern.push(symbol),
            }
        }
    }
    pattern
}
