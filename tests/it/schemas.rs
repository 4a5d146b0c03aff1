//! The schemas of the files that the program reads, beside the program: files are left for `tests/schemas.py`, which `.ci/run`
//! runs behind the tests, as what a schema must take or must refuse.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{names, run};

/// A TOML file by a name of its own: its bytes, and whether the schema must take it.
type File = (String, Vec<u8>, bool);

/// Leaves the schema of the files of `kind`, and each of `files`.
fn leave(kind: &str, files: Vec<File>) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("answers").join(kind);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let schema = run(&format!("schema {kind}")).expect(0).json();
    assert_eq!(schema["$schema"], "http://json-schema.org/draft-07/schema#");
    fs::write(folder.join("schema"), schema.to_string()).unwrap();
    for (name, bytes, is_taken) in files {
        // What is no text or no TOML an editor says without a schema.
        let Some(file) = String::from_utf8(bytes).ok().and_then(|text| toml::from_str::<toml::Table>(&text).ok())
        else {
            assert!(!is_taken, "{name}");
            continue;
        };
        let ending = if is_taken { "json" } else { "refused" };
        fs::write(folder.join(format!("{name}.{ending}")), serde_json::to_string(&file).unwrap()).unwrap();
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files of `folder`, which are to be taken.
fn taken(folder: &str) -> Vec<File> {
    let file = |name: String| {
        let bytes = fs::read(root().join(folder).join(&name)).unwrap();
        (format!("{}-{name}", folder.replace('/', "-")), bytes, true)
    };
    // Tables beside the scenes are none.
    let is_table = |name: &String| Path::new(name).extension().is_some_and(|extension| extension == "csv");
    names(&root().join(folder)).into_iter().filter(|name| !is_table(name)).map(file).collect()
}

/// The hostile files of `kind`, those with the names `of_value` to be taken: only the reader can refuse them.
fn hostile(kind: &str, of_value: &[&str]) -> Vec<File> {
    let mut files = taken(&format!("tests/hostile/{kind}"));
    let is_of = |file: &File, name: &str| file.0.ends_with(&format!("{kind}-{name}.toml"));
    for name in of_value {
        assert!(files.iter().any(|file| is_of(file, name)), "{name}");
    }
    for file in &mut files {
        file.2 = of_value.iter().any(|name| is_of(file, name));
    }
    files
}

/// Shipped scenes, those of earlier faults, the template and texts in every unit are taken; hostile ones are not, but for
/// those that one value alone does not make wrong.
#[test]
fn the_schema_of_scenes_takes_each_that_ships_and_refuses_each_that_is_refused_for_its_form() {
    let template = fs::read(root().join("src/cli/templates/scene.toml")).unwrap();
    let mut files = vec![("template".to_owned(), template, true)];
    files.extend(["verification/scenes", "tests/regressions"].into_iter().flat_map(taken));
    let texts = fs::read(root().join("verification/references/exact.json")).unwrap();
    let texts: Value = serde_json::from_slice(&texts).unwrap();
    let text = |scene: &Value| Some((scene["name"].as_str()?.to_owned(), scene["text"].as_str()?.into(), true));
    let count = files.len();
    files.extend(texts["scenes"].as_array().unwrap().iter().filter_map(text));
    assert!(files.len() > count + 100, "{}", files.len());
    files.extend(hostile(
        "scene",
        &[
            // Beyond the numbers of 64 bits.
            "denormal-mass",
            "denormal-static-factor",
            "overflow",
            "overflow-through-unit",
            "underflow",
            // Stages beside one another, and beside the target.
            "stages-end-huge",
            "stages-end-inside-target",
            "stages-fall",
            "stages-without-end",
            // Texts of conditions, and ends beside other stages.
            "ends-mass-in-last-stage",
            "ends-mass-without-end",
            "ends-parameter-unused",
            "ends-until-beside-table",
            "ends-until-constant",
            "ends-until-empty-side",
            "ends-until-of-two-dimensions",
            "ends-until-two-equals",
            "ends-until-unknown-name",
            "ends-until-without-equals",
            "ends-velocity-in-last-stage",
            "table-of-velocity-until",
            // A plug beside the target.
            "plug-angle-of-90",
            "plug-of-layers",
            "plug-without-thickness",
            // `critical` needs none.
            "velocity-missing",
        ],
    ));
    leave("scene", files);
}

#[test]
fn the_schema_of_suites_takes_those_that_ship_and_refuses_each_that_is_refused_for_its_form() {
    let suites = ["verification/suite.toml", "verification/edges.toml", "src/cli/templates/suite.toml"];
    let suite = |path: &str| {
        // JSON has no such number, which one claim is about.
        let text = fs::read_to_string(root().join(path)).unwrap().replace("value = nan", "value = 0.0");
        (path.replace('/', "-"), text.into_bytes(), true)
    };
    let mut files: Vec<_> = suites.into_iter().map(suite).collect();
    files.extend(hostile("suite", &["id-twice", "scene-elsewhere-broken", "scene-file-missing"]));
    leave("suite", files);
}

/// What an editor shows of a key comes from the table of numbers.
#[test]
fn the_schema_of_scenes_says_of_a_number_what_it_is_and_what_its_absence_means() {
    let schema = run("schema scene").json();
    let key = |path: &str| schema.pointer(path).unwrap_or_else(|| panic!("{path}: {schema}"));
    assert_eq!(key("/properties/resistance/properties/k/default"), &Value::from(2.0));
    let thickness = key("/properties/target/properties/thickness/description");
    assert_eq!(thickness, "thickness H; without it: semi-infinite");
    assert_eq!(key("/properties/stage/items/properties/end/anyOf/0/$ref"), "#/definitions/LengthNotNegative");
}
