use approx::assert_relative_eq;

use super::super::diagnostic::{Place, printable, text_of};
use super::*;
use crate::physics::{Problem, ResolveError, Target};

/// A scene with every table and key.
const FULL: &str = r#"title = "tunnel stop, blunt nose"
[projectile]
mass = "2 kg"
diameter = "50 mm"
nose = { factor = 0.72 }
[target]
strength = "36 MPa"
density = "2300 kg/m^3"
thickness = "180 mm"
[resistance]
S = 12.0
B = 1.0
k = 2.0
crater_stiffness = "8.48e6 N/m"
[impact]
velocity = "300 m/s"
[perforation]
criterion = "ndrc"
"#;

/// A scene of two stages.
const STAGES: &str = r#"[projectile]
mass = 2
[[stage]]
stiffness = "8 MN/m"
viscosity = "1e3 kg/s"
end = "0.1 m"
[[stage]]
static_force = "-10 N"
drag = "3 kg/m"
[impact]
velocity = 300
"#;

fn read(text: &str) -> Scene {
    Scene::from_toml(text, "scene.toml").unwrap_or_else(|error| panic!("{}", error.render(false)))
}

fn refuse(text: &str) -> Box<SceneError> {
    Scene::from_toml(text, "scene.toml").unwrap_err()
}

/// `FULL` with `from` replaced; the test would be void if it were not there.
fn with(from: &str, to: &str) -> String {
    assert!(FULL.contains(from), "{from}");
    FULL.replace(from, to)
}

fn in_stages(from: &str, to: &str) -> String {
    assert!(STAGES.contains(from), "{from}");
    STAGES.replace(from, to)
}

fn text_of_shipped(name: &str) -> &'static str {
    SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap().1
}

fn shipped(name: &str) -> Problem {
    crate::testing::shipped(name).problem().unwrap()
}

#[test]
fn every_key_is_read() {
    let concrete = Concrete {
        diameter: 0.05,
        nose_factor: 0.72,
        strength: 36e6,
        density: 2300.0,
        crater_stiffness: CraterStiffness::Given(8.48e6),
        ..crate::testing::concrete()
    };
    let scene = Scene {
        title: Some("tunnel stop, blunt nose".to_owned()),
        mass: 2.0,
        forces: Vec::new(),
        ends: Vec::new(),
        plug: None,
        parameters: Vec::new(),
        resistance: Resistance::Concrete(concrete),
        thickness: Some(0.18),
        criterion: Criterion::Ndrc,
        velocity: Some(300.0),
    };
    assert_eq!(read(FULL), scene);
}

#[test]
fn every_number_of_a_file_stays_as_the_decimal_that_was_written() {
    let text = with("\"50 mm\"", "\"26.90 mm\"").replace("S = 12.0", "S = 1_2.0");
    let given = SceneFile::from_toml(&text, "scene.toml", &[]).unwrap().written.numbers;
    let decimal = |parameter: Parameter| given.iter().find(|(p, _)| *p == parameter).map(|(_, q)| q.decimal.as_str());
    assert_eq!(decimal(Parameter::Diameter), Some("2690e-5"));
    assert_eq!(decimal(Parameter::StaticFactor), Some("12.0"));
    assert_eq!(given.len(), 11);
    for (parameter, quantity) in &given {
        assert_eq!(quantity.decimal.parse(), Ok(quantity.value), "{parameter}");
    }
}

#[test]
fn everything_optional_has_the_default_of_the_table() {
    let scene = read(
        r#"
        [projectile]
        mass = 2
        diameter = 0.05
        nose.shape = "flat"
        [target]
        strength = 36e6
        density = 2_300"#,
    );
    let concrete = scene.concrete().unwrap();
    assert_eq!((concrete.static_factor, concrete.inertia_factor, concrete.crater_ratio), (12.0, 1.0, 2.0));
    assert_eq!(concrete.crater_stiffness, CraterStiffness::Continuous);
    assert_eq!((concrete.nose_factor, concrete.density), (1.0, 2300.0));
    assert_eq!((scene.title, scene.thickness, scene.velocity), (None, None, None));
    assert_eq!(scene.criterion, Criterion::FullDepth);
}

#[test]
fn stages_are_read_as_given_and_a_key_left_out_is_0() {
    let scene = read(STAGES);
    let crater = Stage { static_force: 0.0, stiffness: 8e6, viscosity: 1e3, drag: 0.0, end: 0.1 };
    let tunnel = Stage { static_force: -10.0, stiffness: 0.0, viscosity: 0.0, drag: 3.0, end: f64::INFINITY };
    assert_eq!(scene.resistance, Resistance::Stages(vec![crater, tunnel]));
    let closed = in_stages("[impact]", "end = 0.3\n[target]\nthickness = \"30 cm\"\n[impact]");
    assert_eq!(read(&closed).problem().unwrap().exit_depth, 0.3);
}

/// A scene file in `folder` of these stages, between 2 kg at 100 m/s and a target of `thickness`; and what is made of it.
fn beside(folder: &Path, stages: &str, thickness: &str) -> Result<Scene, Box<SceneError>> {
    let path = folder.join("scene.toml");
    let text = format!("[projectile]\nmass = 2\n[target]\n{thickness}\n[impact]\nvelocity = 100\n{stages}");
    std::fs::write(&path, text).unwrap();
    Scene::read(&path)
}

#[test]
fn a_force_as_a_table_is_read_in_its_units_and_becomes_the_pieces_up_to_where_it_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let csv = "# measured\nno,x (cm),load_kN\n1,0,0\n2,10,2.5\n3,20,-2.5\n4,40,1.5\n";
    std::fs::write(folder.path().join("r.csv"), csv).unwrap();
    let table = "[[stage]]\nforce = { table = \"r.csv\", x = \"x (cm)\", force = \"load_kN\" }\n";
    let stages = |text: &str, thickness: &str| {
        let problem = beside(folder.path(), text, thickness).unwrap().problem().unwrap();
        let ends: Vec<_> = problem.stages.iter().map(|stage| stage.end).collect();
        (ends, problem.target, problem.exit_depth)
    };
    let (whole, open) = (Target::Stages, Target::StagesToEndOfTable);
    // It falls through zero at 15 cm.
    assert_eq!(stages(table, ""), (vec![0.1, 0.15, 0.2, 0.4, f64::INFINITY], open, f64::INFINITY));
    assert_eq!(stages(table, "thickness = 0.3"), (vec![0.1, 0.15, 0.2, f64::INFINITY], whole, 0.3));
    assert_eq!(stages(table, "thickness = 0.4"), (vec![0.1, 0.15, 0.2, f64::INFINITY], whole, 0.4));
    assert_eq!(stages(table, "thickness = 0.5"), (vec![0.1, 0.15, 0.2, 0.4, f64::INFINITY], open, f64::INFINITY));
    let cut = format!("{table}end = 0.12\n[[stage]]\nstatic_force = 1\n");
    assert_eq!(stages(&cut, "thickness = 2"), (vec![0.1, 0.12, f64::INFINITY], whole, 2.0));
    let short = format!("{table}end = 0.6\n[[stage]]\nstatic_force = 1\n");
    assert_eq!(stages(&short, "thickness = 2").1, open);
    let behind = format!("[[stage]]\ndrag = 1\nend = 0.1\n{table}");
    assert_eq!(stages(&behind, "thickness = 0.3").0, [0.1, 0.15, 0.2, f64::INFINITY]);
    let late = format!("[[stage]]\ndrag = 1\nend = 0.4\n{table}");
    let error = beside(folder.path(), &late, "").unwrap_err();
    assert!(error.message.contains("0 m to 0.4 m") && error.allowed.contains("0.4 m"), "{error:?}");

    let mut scene = beside(folder.path(), &behind, "").unwrap();
    let first = scene.problem().unwrap().stages[1];
    assert_eq!((first.static_force, first.stiffness), (7500.0, -50_000.0));
    // Of a stage with a table only the end is a number of the scene; and it may be moved to where there is no table.
    let of = |which| Parameter::Stage(1, which);
    assert!(of(StageNumber::Drag).get(&scene).is_err() && of(StageNumber::Stiffness).set(&mut scene, 1.0).is_err());
    assert!(of(StageNumber::End).get(&scene).is_ok());
    Parameter::Stage(0, StageNumber::End).set(&mut scene, 0.5).unwrap();
    assert!(matches!(scene.problem(), Err(ResolveError::TableElsewhere { stage: 1, start: 0.5, .. })));
}

#[test]
fn a_force_that_is_no_table_is_refused_where_it_stands_in_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.csv"), "depth_mm,force,force_kN\n0,0,0\n1e-300,1,1e300\n").unwrap();
    let force = |inner: &str| format!("[[stage]]\nforce = {{ table = \"r.csv\", {inner} }}\n");
    let right = force("x = \"depth_mm\", force = \"force_kN\"");
    for (text, message, part) in [
        ("[[stage]]\nforce = \"2*x\"\n".to_owned(), "`2*x` is m", "2*x"),
        ("[[stage]]\nforce = 2\n".to_owned(), "`force` is an integer", "2"),
        (force("V = \"v_m_s\", force = \"force_kN\""), "no column `v_m_s`", "\"v_m_s\""),
        (force("V = \"depth_mm\", force = \"force_kN\""), "no unit of velocity", "\"depth_mm\""),
        (force("x = \"depth_mm\", V = \"v_m_s\", force = \"force_kN\""), "one of depth and one of velocity", "V"),
        (force("force = \"force_kN\""), "no `x`", "{ table"),
        (force("x = \"depth_mm\""), "no `force`", "{ table"),
        (force("x = 1, force = \"force_kN\""), "`x` is an integer", "1"),
        (force("x = \"depth_mm\", force = \"force_kN\", y = \"a\""), "unknown key `y`", "y"),
        (force("x = \"depht_mm\", force = \"force_kN\""), "no column `depht_mm`", "\"depht_mm\""),
        (force("x = \"depth_mm\", force = \"force\""), "no unit of force", "\"force\""),
        (force("x = \"force_kN\", force = \"force_kN\""), "no unit of length", "\"force_kN\""),
        (right.replace("r.csv", "no.csv"), "`no.csv` cannot be read", "\"no.csv\""),
        (right.replace("r.csv", "../"), "is no file", "\"../\""),
        (right.replace("r.csv", "-"), "`-` cannot be read", "\"-\""),
        (format!("{right}drag = 1\n"), "`drag` has no place", "drag"),
        (format!("{right}static_force = 1\n"), "`static_force` has no place", "static_force"),
    ] {
        let error = beside(folder.path(), &text, "").unwrap_err();
        let place = error.place.clone().unwrap();
        let written = std::fs::read_to_string(folder.path().join("scene.toml")).unwrap();
        assert!(error.message.contains(message) && written[place.span.clone()].starts_with(part), "{text}{error:?}");
        assert!(error.file.ends_with("scene.toml"), "{error:?}");
    }
    let rows = |count: u32| (0..count).fold(String::new(), |rows, depth| rows + &format!("{depth},1\n"));
    let many = right.replace("r.csv", "many.csv");
    for (count, line) in [(20_000, None), (20_001, Some(20_002))] {
        std::fs::write(folder.path().join("many.csv"), format!("depth_mm,force_kN\n{}", rows(count))).unwrap();
        let place = beside(folder.path(), &many, "").err().and_then(|error| error.place);
        assert_eq!(place.map(|place| place.line), line);
    }
    let steep = beside(folder.path(), &right, "").unwrap_err();
    assert!(steep.file.ends_with("r.csv") && steep.place.is_some_and(|place| place.line == 3));
}

#[test]
fn noses_are_read_by_shape() {
    for (nose, factor) in [
        ("{ shape = \"flat\" }", 1.0),
        ("{ shape = \"ogive\", caliber_radius_head = 2 }", 0.15625),
        ("{ shape = \"cone\", length_ratio = 1.0 }", 0.2),
        ("{ shape = \"spherical\", radius_ratio = 0.5 }", 0.5),
        ("{ shape = \"hemispherical\" }", 0.5),
        ("{ shape = \"truncated-ogive\", caliber_radius_head = 2, tip_ratio = 0 }", 0.15625),
        ("{ shape = \"truncated-ogive\", caliber_radius_head = 2, tip_ratio = 1 }", 1.0),
        // t² + (1 - t²)/(1 + (2 psi/(1 - t))²) = 1/4 + (3/4)/17.
        ("{ shape = \"truncated-cone\", length_ratio = 1, tip_ratio = 0.5 }", 0.25 + 0.75 / 17.0),
        ("{ factor = 0 }", 0.0),
    ] {
        let scene = read(&with("{ factor = 0.72 }", nose));
        assert_relative_eq!(scene.concrete().unwrap().nose_factor, factor, max_relative = 1e-15);
    }
}

#[test]
fn layers_sum_up_and_the_one_beyond_the_crater_stands_for_the_target() {
    let problem = shipped("layered");
    assert_eq!((problem.target, problem.crater), (Target::Stages, Some(0)));
    assert_eq!(problem.stages.iter().map(|stage| stage.end).collect::<Vec<_>>(), [0.1, 0.12, 0.2, f64::INFINITY]);
    assert_relative_eq!(problem.exit_depth, 0.4, max_relative = 1e-15);
    let text = text_of_shipped("layered");
    let gap = text.replace("25 MPa", "0 MPa").replace("thickness = \"200 mm\"\n", "S = 10\nviscosity = 5\n");
    let scene = read(&gap.replace("velocity = \"250 m/s\"", "velocity = 1"));
    let concrete = scene.concrete().unwrap();
    assert_eq!((concrete.strength, scene.thickness), (60e6, None));
    assert_eq!((concrete.layers[1].static_factor, concrete.layers[2].static_factor), (0.0, 10.0));
    assert_eq!((concrete.layers[2].viscosity, concrete.layers[2].thickness), (5.0, f64::INFINITY));
    assert!(scene.problem().is_ok());
}

#[test]
fn shipped_scenes_are_the_files_and_each_resolves_with_a_title_and_a_comment() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/scenes");
    let files = std::fs::read_dir(&folder).unwrap().count();
    assert_eq!(files, SHIPPED.len() + force_table::SHIPPED_TABLES.len());
    for (name, text) in force_table::SHIPPED_TABLES {
        assert_eq!(std::fs::read_to_string(folder.join(name)).unwrap(), *text);
    }
    for (name, text) in SHIPPED {
        let scene = Scene::read(&folder.join(name).with_extension("toml")).unwrap();
        assert_eq!(scene, Scene::from_toml(text, name).unwrap());
        assert!(scene.problem().is_ok() && scene.title.is_some() && text.starts_with("# "), "{name}");
    }
}

#[test]
fn the_shipped_shot_is_the_one_of_forrestal() {
    let scene = Scene { title: None, ..read(SHIPPED[0].1) };
    assert_eq!(scene, crate::testing::scene());
}

#[test]
fn paper_slab_and_stage_scenes_are_what_their_comments_say() {
    let paper = shipped("paper-slab");
    assert_relative_eq!(paper.mass / (2400.0 * 0.06_f64.powi(3)), 38.58, epsilon = 5e-3);
    assert_eq!((paper.exit_depth, paper.stages[0].end), (0.3, 0.12));
    let stiff = shipped("stiff");
    assert_eq!((stiff.exit_depth, stiff.stages[0].static_force, stiff.stages.len()), (9.0, -1000.0, 1));
    let viscous = shipped("viscous");
    assert!(viscous.stages[0].resists() && !viscous.has_exit());
    assert_eq!(viscous.stages[0].viscosity, stiff.stages[0].viscosity);
    assert_eq!(shipped("graze").exit_depth, 0.200_771_166_635);
}

#[test]
fn a_byte_order_mark_and_windows_line_ends_are_no_fault() {
    let text = text_of([b"\xef\xbb\xbf", FULL.replace('\n', "\r\n").as_bytes()].concat(), "scene.toml").unwrap();
    assert_eq!(read(&text), read(FULL));
    let bad = refuse(&text.replace("36 MPa", "36 m"));
    assert_eq!(bad.location(), "scene.toml:7:16");
    assert!(!bad.render(false).contains('?'), "{}", bad.render(false));
    let first_line = text_of(b"\xef\xbb\xbfx = 1".to_vec(), "scene.toml").unwrap();
    assert_eq!(refuse(&first_line).place.unwrap().span, 0..1);
}

/// Edits of `FULL` or `STAGES`, as a person sees their refusals; those of the corpus `tests/hostile/scene` are in
/// `tests/it/snapshots`.
#[test]
fn every_other_refusal_names_its_place_its_cause_and_a_remedy() {
    let nose = "{ factor = 0.72 }";
    let mut shown = String::new();
    for text in [
        with("[target]\n", "[target]\nk = 2\n"),
        with("strength = \"36 MPa\"\n", ""),
        with("density = \"2300 kg/m^3\"\n", ""),
        with("diameter = \"50 mm\"\n", ""),
        with("nose = { factor = 0.72 }\n", ""),
        with("velocity = \"300 m/s\"\n", ""),
        with(nose, "0.72"),
        with(nose, "{ factor = 0.7, length_ratio = 1.0 }"),
        with(nose, "{ shape = \"flat\", radius_ratio = 1.0 }"),
        with(nose, "{ shape = 3 }"),
        with(nose, "{ shape = \"cone\" }"),
        with(nose, "{ shape = \"truncated-cone\", length_ratio = 1.0 }"),
        with(nose, "{ shape = \"truncated-ogive\", length_ratio = 1.0, tip_ratio = 0.2 }"),
        with(nose, "{ shape = \"truncated-ogive\", caliber_radius_head = 3, tip_ratio = 1.2 }"),
        with("8.48e6 N/m", "continous"),
        with("8.48e6 N/m", "8.48e6 N"),
        with("[target]\n", "[target]\nlayer = []\n"),
        with("[target]\n", "[target]\nlayer = 3\n"),
        with("[resistance]", "[[target.layer]]\n[resistance]"),
        in_stages("[impact]", "[resistance]\nk = 2\n[impact]"),
        in_stages("[impact]", "[target]\ndensity = 1\n[impact]"),
        in_stages("[impact]", "[perforation]\ncriterion = \"ndrc\"\n[impact]"),
        in_stages("[impact]", "end = 1\n[target]\nthickness = 2\n[impact]"),
        in_stages("[impact]", "end = 1\n[impact]"),
        STAGES.replace("[[stage]]", "[stage]"),
        "stage = []\nprojectile.mass = 1".to_owned(),
        "[stage]\n[projectile]\nmass = 1".to_owned(),
        "stage = [3]\nprojectile.mass = 1".to_owned(),
        "projectile = 3".to_owned(),
        "impact = 3".to_owned(),
        "projectile.mss = 3".to_owned(),
    ] {
        let error = refuse(&text);
        assert!(error.place.is_some() && !error.allowed.is_empty() && !error.help.is_empty(), "{error}");
        shown += &error.render(false);
    }
    snapbox::assert_data_eq!(shown, snapbox::file!["snapshots/refusals.txt"].raw());
}

/// `text` with `value` in place of what it gives for `parameter`.
fn with_value(text: &str, parameter: Parameter, value: &toml::Value) -> String {
    let mut file: toml::Value = text.parse::<toml::Table>().unwrap().into();
    let mut place = &mut file;
    for word in parameter.to_string().split('.') {
        place = if let Ok(index) = word.parse::<usize>() { &mut place[index] } else { &mut place[word] };
    }
    *place = value.clone();
    toml::to_string(&file).unwrap()
}

#[test]
fn admissible_ranges_are_those_of_the_table() {
    let layers = text_of_shipped("layered").replace("density", "viscosity = 5\nS = 9\ndensity");
    let numbers = [f64::MIN_POSITIVE, 1e-9, 0.5, 1.0, 1.1, 1e9, 1e300, 0.0, -0.0, -1e-300, -0.1, -1.0];
    for text in [FULL, STAGES, &layers] {
        for (parameter, _) in SceneFile::from_toml(text, "scene.toml", &[]).unwrap().written.numbers {
            // An air gap has no S; a file gives none that is zero.
            let is_factor = parameter.key() == Parameter::StaticFactor.key();
            let range = if is_factor { Parameter::StaticFactor } else { parameter }.entry().range;
            for value in numbers.into_iter().chain([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
                let read = Scene::from_toml(&with_value(text, parameter, &value.into()), "scene.toml");
                assert_eq!(read.is_ok(), range.contains(value), "{parameter} = {value}: {read:?}");
                assert!(read.err().is_none_or(|error| !error.message.is_empty() && error.place.is_some()), "{value}");
            }
            for other in ["".into(), toml::Value::Array(Vec::new())] {
                refuse(&with_value(text, parameter, &other));
            }
        }
    }
    for (shape, least) in [
        ("shape = \"ogive\", caliber_radius_head", 0.5),
        ("shape = \"spherical\", radius_ratio", 0.5),
        ("shape = \"cone\", length_ratio", f64::MIN_POSITIVE),
    ] {
        let text = |value: f64| with("{ factor = 0.72 }", &format!("{{ {shape} = {value:e} }}").replace("NaN", "nan"));
        for value in [least, 1e9] {
            read(&text(value));
        }
        for value in [0.9999 * least, 0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            refuse(&text(value));
        }
    }
}

fn set(text: &str, settings: &[&str]) -> Result<Scene, Box<SceneError>> {
    let settings: Vec<_> = settings.iter().map(|setting| (*setting).to_owned()).collect();
    SceneFile::from_toml(text, "scene.toml", &settings).map(|read| read.scene)
}

/// `text` without what it gives at `path`.
fn without(text: &str, path: &str) -> String {
    let mut file: toml::Table = text.parse().unwrap();
    let (home, key) = path.rsplit_once('.').unwrap();
    let mut table = &mut file;
    for word in home.split('.') {
        table = table[word].as_table_mut().unwrap();
    }
    table.remove(key).unwrap();
    toml::to_string(&file).unwrap()
}

#[test]
fn what_is_set_is_as_if_the_file_gave_it() {
    for (_, text) in SHIPPED {
        for (parameter, quantity) in SceneFile::from_toml(text, "scene.toml", &[]).unwrap().written.numbers {
            // Has a unit of the file's own.
            if matches!(parameter, Parameter::Own(_)) {
                continue;
            }
            // Within the range of each number, and within the next boundary of a stage.
            let value = 1.0625 * quantity.value;
            let stated = read(&with_value(text, parameter, &value.into()));
            let unit = parameter.entry().dimension.map_or("", |dimension| dimension.units()[0]);
            for setting in [format!("{parameter}={value:e}"), format!(" {parameter} = {value:e}{unit} ")] {
                assert_eq!(set(text, &[&setting]).as_ref(), Ok(&stated), "{setting}");
            }
        }
    }
    // What the file leaves out.
    for (path, value) in [
        ("impact.velocity", "0.3km/s"),
        ("target.thickness", "'180 mm'"),
        ("resistance.S", "12.0"),
        ("perforation.criterion", "ndrc"),
        ("projectile.nose.factor", "0.72"),
        ("resistance.crater_stiffness", "8.48e6 N/m"),
    ] {
        assert_eq!(set(&without(FULL, path), &[&format!("{path}={value}")]).unwrap(), read(FULL), "{path}");
    }
    let bare = FULL.replace("[impact]\nvelocity = \"300 m/s\"\n", "");
    assert_eq!(set(&bare, &["impact.velocity=300"]).unwrap(), read(FULL));
    assert_eq!(set(FULL, &["title=7 = seven"]).unwrap().title.unwrap(), "7 = seven");
    // S that the file leaves to Eq. 14 follows the strength, and a nose is another one as a whole.
    let scene = set(&without(FULL, "resistance.S"), &["target.strength=144MPa"]).unwrap();
    assert_eq!(scene.concrete().unwrap().static_factor, 6.0);
    let ogive = ["projectile.nose.caliber_radius_head=3", "projectile.nose.shape=ogive"];
    let stated = read(&with("{ factor = 0.72 }", "{ shape = \"ogive\", caliber_radius_head = 3 }"));
    assert_eq!(set(FULL, &ogive[1..]).unwrap_err().message, "the nose has no `caliber_radius_head`");
    for text in [FULL.to_owned(), with("{ factor = 0.72 }", "{ shape = \"cone\", length_ratio = 2 }")] {
        assert_eq!(set(&text, &ogive).unwrap(), stated);
    }
}

#[test]
fn a_setting_that_is_none_says_where_and_why() {
    let mut shown = String::new();
    for (text, settings) in [
        (FULL, &["impact.velocity"][..]),
        (FULL, &["impact.velocity=400 m", "target.density=-1"]),
        (FULL, &["impact.velocity=400m/s", "target.density=-1"]),
        (FULL, &["impact.velocity="]),
        (FULL, &["target.strenght=5MPa"]),
        (FULL, &["strength=5MPa"]),
        (FULL, &["H/d=5"]),
        (FULL, &["nothing=5"]),
        (FULL, &["stage.0.drag=5"]),
        (STAGES, &["stage.2.drag=5"]),
        (STAGES, &["stage.1.darg=5"]),
        (STAGES, &["target.strength=5MPa"]),
        (STAGES, &["stage.0.end=5", "stage.1.end=4"]),
        (FULL, &["resistance.k=2", "resistance.B=2", "resistance.k=3"]),
        (FULL, &["resistance.k=2 m"]),
        (FULL, &["projectile.nose.factor=1", "projectile.nose.shape=flat"]),
        (FULL, &["perforation.criterion=ndrk"]),
        ("projectile = 2", &["projectile.mass=2"]),
    ] {
        shown += &set(text, settings).unwrap_err().render(false);
    }
    snapbox::assert_data_eq!(shown, snapbox::file!["snapshots/settings.txt"].raw());
}

#[test]
fn only_the_last_layer_goes_without_a_thickness_and_the_sum_is_finite() {
    let text = text_of_shipped("layered");
    let error = refuse(&text.replace("thickness = \"80 mm\"\n", ""));
    assert_eq!(error.message, "[[target.layer]] has no `thickness`");
    assert_eq!(error.place.unwrap().line, 16);
    let huge = text.replace("80 mm", "1.7e308 m").replace("200 mm", "1.7e308 m");
    assert_eq!(refuse(&huge).message, "the layers sum up to no finite thickness");
}

#[test]
fn a_static_factor_of_the_scene_holds_for_layers_without_their_own() {
    let text = text_of_shipped("layered");
    let scene = read(&text.replace("k = 2.0", "k = 2.0\nS = 9.0").replacen("density", "S = 7.0\ndensity", 1));
    let factors: Vec<_> = scene.concrete().unwrap().layers.iter().map(|layer| layer.static_factor).collect();
    assert_eq!(factors, [7.0, 9.0, 9.0]);
}

#[test]
fn unreadable_files_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let refused = |path: &Path| {
        let error = Scene::read(path).unwrap_err();
        assert!(error.render(false).contains(&error.location()), "{error}");
        (error.place.clone(), error.message)
    };
    assert_eq!(refused(folder.path()), (None, "this is a directory".to_owned()));
    let (place, message) = refused(&at("absent.toml"));
    assert!(place.is_none() && message.starts_with("the file cannot be read: "), "{message}");
    std::fs::write(at("limit.toml"), [FULL, &"#".repeat((1 << 20) - FULL.len())].concat()).unwrap();
    assert!(Scene::read(&at("limit.toml")).is_ok());
    std::fs::write(at("large.toml"), [FULL, &"#".repeat((1 << 20) - FULL.len() + 1)].concat()).unwrap();
    let too_large = (None, "the file is larger than 1 MiB, and was not read".to_owned());
    assert_eq!(refused(&at("large.toml")), too_large);
    // A file whose length is known only by reading it.
    #[cfg(target_os = "linux")]
    assert_eq!(refused(Path::new("/dev/zero")), too_large);
}

#[test]
fn a_carriage_return_stays_only_as_part_of_a_line_end() {
    assert_eq!(printable("a\rb\r\nc\n\rd\r"), "a?b\r\nc\n?d?");
}

#[test]
fn a_quoted_piece_is_cut_after_60_characters_and_says_so() {
    for (length, shown, end) in [(59, 59, ""), (60, 60, ""), (61, 60, "…"), (62, 60, "…"), (200, 60, "…")] {
        assert_eq!(quoted(&"ü".repeat(length)), format!("`{}{end}`", "ü".repeat(shown)), "{length}");
    }
}

#[test]
fn a_line_is_underlined_up_to_240_characters() {
    // Neither the line before, which ends in a letter of two bytes, nor the one behind counts.
    for (length, underlined) in [(1, true), (239, true), (240, true), (241, false), (242, false)] {
        let line = if length == 1 { "x".to_owned() } else { format!("x = 1 # {}", "ü".repeat(length - 8)) };
        let error = Fault::new(5..6, "no", "yes", "go").in_file("f", &format!("# é\n{line}\ny = 1\n"));
        assert_eq!(error.location(), "f:2:1");
        assert_eq!(error.render(false).contains("│ ┬"), underlined, "{}", error.render(false));
    }
}

#[test]
fn a_span_within_a_letter_begins_at_the_letter() {
    for start in 8..11 {
        let error = Fault::new(start..14, "no", "yes", "go").in_file("f", "a = 1\nä€ = 2");
        assert_eq!((error.location().as_str(), error.place.unwrap().span), ("f:2:2", 8..14));
    }
}

#[test]
fn a_key_over_several_lines_is_refused_in_its_first() {
    let error = refuse("a = 1\n\"\"\"b\nc\"\"\" = 2\nd = 3\n");
    assert!(error.message.starts_with("this is not TOML: keys cannot be multi-line"), "{error}");
    assert_eq!(error.place.unwrap(), Place { line: 2, column: 1, span: 6..10 });
}

#[test]
fn a_misspelling_has_one_slip_in_three_letters_and_never_in_all() {
    for (text, known, likely) in [
        ("xyzdefghi", "abcdefghi", true),
        ("xyzwefghi", "abcdefghi", false),
        ("xycdefgh", "abcdefgh", true),
        ("xyzdefgh", "abcdefgh", false),
        ("xbcd", "abcd", true),
        ("xycd", "abcd", false),
        ("xb", "ab", true),
        ("xy", "ab", false),
        ("A", "a", true),
        ("x", "a", false),
        ("bacd", "abcd", true),
    ] {
        assert_eq!(nearest(text, &[known]), likely.then_some(known), "{text} for {known}");
    }
    assert_eq!(nearest("abd", &["xyz", "abc", "abde"]), Some("abc"));
    let long = "a".repeat(60);
    assert_eq!(nearest(&long, &[&long]), Some(long.as_str()));
    assert_eq!(nearest(&"a".repeat(61), &[&long]), None);
}

#[test]
fn colours_appear_only_when_asked_for() {
    let error = refuse("");
    assert!(error.render(true).contains('\u{1b}') && !error.render(false).contains('\u{1b}'));
}

#[test]
fn a_line_of_any_length_gives_a_short_message() {
    let long = format!("{} = 1", "x".repeat(100_000));
    let error = refuse(&long);
    assert!(error.render(false).len() < 1000, "{}", error.render(false));
    assert_eq!(error.location(), "scene.toml:1:1");
    let unit = with("50 mm", &format!("50 {}", "y".repeat(100_000)));
    assert!(refuse(&unit).render(false).len() < 1000);
}

proptest::proptest! {
    /// Any text gives a scene or an error that can be shown, never a panic.
    #[test]
    fn arbitrary_text_is_read_or_refused(text in ".{0,80}") {
        if let Err(error) = Scene::from_toml(&text, &text) {
            proptest::prop_assert!(!error.render(true).is_empty());
        }
    }

    /// So does a scene with any one piece replaced by any other text, and what is read resolves to finite numbers.
    #[test]
    fn a_mutilated_scene_is_read_or_refused(
        stages in proptest::bool::ANY,
        start in 0_usize..400,
        length in 0_usize..12,
        insert in "[-0-9a-z\\[\\]{}=\"'.,# \n\u{e4}\u{1b}]{0,6}",
    ) {
        let source = if stages { STAGES } else { FULL };
        let start = start.min(source.len());
        let end = (start + length).min(source.len());
        let text = [&source[..start], &insert, &source[end..]].concat();
        match Scene::from_toml(&text, "scene.toml") {
            Err(error) => {
                let place = error.place.clone().unwrap();
                proptest::prop_assert!(text.get(place.span).is_some());
                proptest::prop_assert!(error.render(false).contains(&error.message));
            }
            Ok(scene) => {
                if let Ok(problem) = scene.problem() {
                    for stage in &problem.stages {
                        let force = [stage.static_force, stage.stiffness, stage.viscosity, stage.drag];
                        proptest::prop_assert!(force.iter().all(|number| number.is_finite()));
                    }
                }
            }
        }
    }
}

/// Mistakes in forces and their parameters, each as a person sees it.
#[test]
fn a_force_that_is_no_expression_is_underlined_where_it_is_wrong() {
    let mut shown = String::new();
    for (parameters, force) in [
        ("P = '848 kN'\nQ = '3.25 kg/m'", "P + Q V^2"),
        ("P = '848 kN'", "P + S*V"),
        ("P = '848 kN'\nQ = '3.25 kg/m'", "P + Q*V"),
        ("P = '848 kN'", "P*V^x"),
        ("P = '848 kN'\nv1 = '50 m/s'", "P*(1 + log(V))"),
        ("P = '848 kN'", "P*sinh(x)"),
        ("P = '848 kN'\nb = 2", "P"),
        ("x = '848 kN'", "x"),
        ("P = '848 kM'", "P"),
        ("P = '848'", "P"),
        ("P = [1]", "P"),
        ("P = '848 kN'", "P*(1 + 2"),
        ("P = '848 kN'\nl = '1 m'", "P + sqrt(l)*P"),
    ] {
        let text = format!("projectile.mass = 2\n[parameters]\n{parameters}\n[[stage]]\nforce = \"{force}\"\n");
        let error = Scene::from_toml(&text, "law.toml").unwrap_err();
        shown += &error.render(false);
    }
    snapbox::assert_data_eq!(shown, snapbox::file!["snapshots/laws.txt"].raw());
}

#[test]
fn parameters_have_any_unit_and_a_scene_without_a_force_has_none() {
    let scene = |unit: &str, force: &str| {
        let text = format!("projectile.mass = 2\nparameters.a = {unit}\n[[stage]]\nforce = \"{force}\"\n");
        Scene::from_toml(&text, "law.toml")
    };
    for (unit, force, value) in [
        ("'2 kN/mm^2'", "a*x^2", 2e9),
        ("'3 kPa s'", "a*x*V", 3e3),
        ("'7 N s^2/m^2'", "a*V^2", 7.0),
        ("'4 kg/(m s)'", "a*x*V", 4.0),
    ] {
        assert_eq!(scene(unit, force).unwrap().parameters[0].value, value, "{unit}");
    }
    let concrete = format!("{FULL}\n[parameters]\nP = 1\n");
    assert!(Scene::from_toml(&concrete, "law.toml").unwrap_err().message.contains("`parameters` has no place"));
}

#[test]
fn a_parameter_is_set_with_a_unit_or_else_in_that_of_the_file() {
    let text = text_of_shipped("law-poncelet");
    let stated = read(&text.replace("400 MPa", "300 MPa"));
    for setting in ["parameters.a=300MPa", "parameters.a=3e8", "parameters.a = 3e8 Pa"] {
        assert_eq!(set(text, &[setting]).as_ref(), Ok(&stated), "{setting}");
    }
    assert!(set(text, &["parameters.a=300m"]).is_err());
    let mut moved = read(text);
    Parameter::Own(Name::new("a").unwrap()).set(&mut moved, 3e8).unwrap();
    assert_eq!(moved, stated);
}
