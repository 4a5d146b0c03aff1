//! Sweeps, map, measured data, sensitivities and uncertainty, as typed on a command line.

#![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

const SLAB: &str = "verification/scenes/paper-slab.toml";

/// What the program said: exit code, standard output, standard error.
fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("penetrode").unwrap().args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn json(arguments: &[&str]) -> Value {
    let (code, out, err) = run(arguments);
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

fn conforms(command: &str, value: &Value) {
    let (code, schema, _) = run(&["schema", command]);
    assert_eq!(code, 0);
    let schema: Value = serde_json::from_str(&schema).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let faults: Vec<_> = validator.iter_errors(value).map(|error| error.to_string()).collect();
    assert!(faults.is_empty(), "{faults:?}");
}

#[test]
fn a_sweep_of_thickness_writes_its_table_and_figures_4_and_5() {
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "fig4.csv");
    let (code, text, _) = run(&["sweep", SLAB, "--vary", "H/d=0.5:18:36", "--out", &out]);
    assert_eq!(code, 0);
    assert!(text.contains("N = 38.58") && text.contains("1.24"), "{text}");
    let table = std::fs::read_to_string(&out).unwrap();
    let mut lines = table.lines();
    let contract = "H/d,outcome,depth_m,velocity_m_s,critical_velocity_m_s,critical_energy_j,dimensionless_energy,\
                    eq15_printed,eq15_unrounded,error";
    assert!(lines.next().unwrap().starts_with(contract));
    assert_eq!(lines.clone().count(), 36);
    assert!(lines.clone().next().unwrap().starts_with("0.5,") && lines.next_back().unwrap().starts_with("18,"));
    for (name, words) in [("fig4.svg", "simulation, full depth"), ("fig4-difference.svg", "difference [%]")] {
        let svg = std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(svg.starts_with("<?xml") && svg.trim_end().ends_with("</svg>") && svg.contains(words), "{name}");
    }
}

#[test]
fn numbers_of_the_table_read_back_to_those_of_the_json() {
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "t.csv");
    let value = json(&["sweep", SLAB, "--vary", "N=3:300:7:log", "--out", &out, "--json"]);
    conforms("sweep", &value);
    let mut table = csv::Reader::from_path(&out).unwrap();
    let header = table.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    for (record, row) in table.records().zip(value["rows"].as_array().unwrap()) {
        let record = record.unwrap();
        assert_eq!(record[column("N")].parse::<f64>().unwrap(), row["values"][0].as_f64().unwrap());
        for name in ["depth_m", "critical_velocity_m_s", "critical_energy_j", "dimensionless_energy", "eq15_printed"] {
            assert_eq!(record[column(name)].parse::<f64>().unwrap(), row[name].as_f64().unwrap(), "{name}");
        }
    }
}

#[test]
fn every_row_is_what_critical_and_solve_say_of_its_scene() {
    let row = &json(&["sweep", SLAB, "--vary", "H/d=5:5:1", "--json"])["rows"][0];
    let critical = json(&["critical", SLAB, "--json"]);
    assert_eq!(row["critical_velocity_m_s"], critical["critical_velocity_m_s"]);
    assert_eq!(row["dimensionless_energy"], critical["dimensionless_energy"]);
    assert_eq!(row["eq15_printed"], critical["eq15"]["printed"]);
    let solve = json(&["solve", SLAB, "--json"]);
    assert_eq!((&row["outcome"], &row["velocity_m_s"]), (&solve["outcome"], &solve["velocity_m_s"]));
}

#[test]
fn two_axes_with_units_give_every_pair_and_say_that_s_follows() {
    let vary = ["--vary", "target.strength=20MPa:60MPa:3:log", "--vary", "H/d=2:8:4"];
    let value = json(&[&["sweep", SLAB, "--json"][..], &vary].concat());
    assert_eq!(value["rows"].as_array().unwrap().len(), 12);
    assert_eq!(value["static_factor_follows_strength"], true);
    let (_, text, _) = run(&[&["sweep", SLAB][..], &vary].concat());
    assert!(text.contains("S follows the strength by Eq. 14"), "{text}");
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "two.csv");
    assert_eq!(run(&[&["sweep", SLAB, "--out", &out][..], &vary].concat()).0, 0);
    let svg = std::fs::read_to_string(folder.path().join("two.svg")).unwrap();
    assert!(svg.contains("H/d = 8") && svg.contains("target.strength [Pa]"));
}

#[test]
fn measured_points_stand_beside_the_curves_at_their_own_thickness() {
    let folder = TempDir::new().unwrap();
    let points = path(&folder, "points.csv");
    std::fs::write(&points, "H/d,E_c/(d3 fc)\n3,10\n12.5,100\n").unwrap();
    let out = path(&folder, "fig4.csv");
    let arguments = ["sweep", SLAB, "--vary", "H/d=1:18:5", "--data", &points, "--out", &out, "--json"];
    let value = json(&arguments);
    let data = value["data"].as_array().unwrap();
    assert_eq!((data.len(), &data[1]["measured"]), (2, &Value::from(100.0)));
    let alone = json(&["sweep", SLAB, "--vary", "H/d=12.5:12.5:1", "--json"]);
    assert_eq!(data[1]["energy_full_depth"], alone["rows"][0]["energy_full_depth"]);
    assert!(std::fs::read_to_string(folder.path().join("fig4.svg")).unwrap().contains("measured"));
    std::fs::write(&points, "H/d,E_c/(d3 fc)\n3,ten\n").unwrap();
    let (code, out, err) = run(&arguments);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("points.csv:2, column 2: `ten` in"), "{err}");
}

#[test]
fn a_bad_row_keeps_its_message_and_the_exit_code_is_3() {
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "t.csv");
    let (code, _, err) = run(&["sweep", SLAB, "--vary", "projectile.mass=-1kg:1kg:3", "--out", &out]);
    assert_eq!(code, 3);
    assert!(err.contains("2 of 3 points have no answer"), "{err}");
    let table = std::fs::read_to_string(&out).unwrap();
    assert!(table.lines().nth(1).unwrap().contains("mass") && table.lines().count() == 4, "{table}");
}

#[test]
fn requests_that_cannot_be_served_exit_2_and_write_nothing() {
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "t.csv");
    let parquet = path(&folder, "t.parquet");
    for (arguments, words) in [
        (vec!["--vary", "H/d"], "PATH=A:B:N"),
        (vec!["--vary", "H/d=1:2:1"], "number of values"),
        (vec!["--vary", "colour=1:2:3"], "names no number"),
        (vec!["--vary", "target.strength=1mm:2mm:3"], "unit of length"),
        (vec!["--vary", "target.layer.0.strength=1:2:3"], "fewer layers"),
        (vec!["--vary", "H/d=1:2:3", "--vary", "target.thickness=1:2:3"], "both set"),
        (vec!["--vary", "H/d=1:2:3", "--vary", "N=1:2:3", "--vary", "I=1:2:3"], "once or twice"),
        (vec!["--vary", "H/d=1:2:3", "--dt", "1us"], "--dt"),
        (vec!["--vary", "N=1:2:3", "--data", SLAB], "H/d"),
    ] {
        let (code, stdout, err) = run(&[&["sweep", SLAB, "--out", &out][..], &arguments].concat());
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(err.contains(words), "{arguments:?}: {err}");
    }
    if !cfg!(feature = "parquet") {
        let (code, _, err) = run(&["sweep", SLAB, "--vary", "H/d=1:2:3", "--out", &parquet]);
        assert!(code == 2 && err.contains("build with `--features parquet`"), "{err}");
    }
    assert_eq!(run(&["sweep", SLAB]).0, 2);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_table_without_a_folder_to_go_to_is_refused() {
    let (code, _, err) = run(&["sweep", SLAB, "--vary", "H/d=1:2:3", "--out", "no/such/folder/t.csv"]);
    assert_eq!(code, 2);
    assert!(err.contains("there is no folder"), "{err}");
}

#[test]
fn scenes_outside_eq_11_12_are_warned_of_on_standard_error_alone() {
    for command in ["solve", "critical"] {
        let (code, out, err) = run(&[command, SLAB]);
        assert_eq!(code, 0);
        assert!(err.contains("outside Eq. 11-12") && !out.contains("outside Eq. 11-12"), "{err}");
        let (_, _, err) = run(&[command, "verification/scenes/perforate-no-drag.toml"]);
        assert!(!err.contains("Eq. 11-12"), "{err}");
    }
}

#[test]
fn the_report_of_the_suite_shows_measured_points_with_the_curve_or_refuses_them() {
    let folder = TempDir::new().unwrap();
    let (points, out) = (path(&folder, "points.csv"), path(&folder, "report"));
    std::fs::write(&points, "H/d,E_c/(d3 fc)\n5,30.5\n10,80\n").unwrap();
    let (code, _, err) = run(&["verify", "--only", "sweep/", "--data", &points, "--out", &out]);
    assert_eq!(code, 0, "{err}");
    let table = std::fs::read_to_string(folder.path().join("report/tables/critical-energy.csv")).unwrap();
    assert!(table.contains("\ncritical impact energy,measured,H/d,5,E_c/(d³ f_c),30.5\n"), "{table:.300}");
    let page = std::fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    assert!(page.contains("measured</text>") && page.contains("--data "));
    // Nothing of the suite sweeps H/d: the points would be shown nowhere.
    let (code, _, err) = run(&["verify", "--only", "nose/", "--data", &points, "--out", &path(&folder, "none")]);
    assert!(code == 2 && err.contains("--data") && !folder.path().join("none").exists(), "{err}");
}

#[test]
fn the_map_has_lines_of_three_errors_and_the_measured_scenes() {
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "map.csv");
    let value = json(&["map", "--out", &out, "--json"]);
    conforms("map", &value);
    assert_eq!(value["lines"].as_array().unwrap().len(), 6);
    assert_eq!(value["scenes"].as_array().unwrap().len(), 107);
    let svg = std::fs::read_to_string(folder.path().join("map.svg")).unwrap();
    for words in ["Eq. 11 too shallow", "Eq. 12 too deep", "20 %", "Sliter1980"] {
        assert!(svg.contains(words), "{words}");
    }
    assert!(std::fs::read_to_string(&out).unwrap().starts_with("level,I,N\n0.01,"));
    assert_eq!(run(&["map", "--k", "0"]).0, 2);
    assert_eq!(run(&["map", "--k", "nan"]).0, 2);
}

#[test]
fn shipped_experiments_say_what_they_validate_and_what_is_not_given() {
    let folder = TempDir::new().unwrap();
    let out = path(&folder, "exp.csv");
    let (code, text, _) = run(&["experiments", "--out", &out]);
    assert_eq!(code, 0);
    for words in ["Forrestal1994", "not given", "critical velocity", "13 kg", "u_val² = u_num² + u_input² + u_D²"] {
        assert!(text.contains(words), "{words}\n{text}");
    }
    let svg = std::fs::read_to_string(folder.path().join("exp.svg")).unwrap();
    assert!(svg.contains("±20 %"));
    conforms("experiments", &json(&["experiments", "--json"]));
}

#[test]
fn a_table_of_ones_own_works_the_same_way_and_its_errors_have_a_place() {
    let folder = TempDir::new().unwrap();
    let own = path(&folder, "own.csv");
    let header = "V0_m_s,depth_mm,M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,depth_uncertainty_mm,colour";
    std::fs::write(&own, format!("{header}\n277,173,0.906,26.9,ogive,2,35.2,2370,4,red\n")).unwrap();
    let value = json(&["experiments", &own, "--spread", "target.strength=5%", "--json"]);
    conforms("experiments", &value);
    assert_eq!((&value["sets"][0]["set"], &value["meaning"]), (&Value::from("own"), &Value::Null));
    assert!(value["shots"][0]["validation_uncertainty_m"].as_f64().unwrap() > 0.004);
    let same = json(&["experiments", "verification/experiments/huang2011_penetration.csv", "--json"]);
    assert_eq!(same["sets"][0]["shots"], 8);
    std::fs::write(&own, format!("{header}\n277,173,0.906,26.9,blunt,2,35.2,2370,,\n")).unwrap();
    let (code, out, err) = run(&["experiments", &own]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("own.csv:2, column 5: `blunt` in `nose`"), "{err}");
    assert_eq!(run(&["experiments", "no-such.csv"]).0, 2);
}

#[test]
fn sensitivities_stand_in_table_and_json_only_when_asked_for() {
    let (_, text, _) = run(&["solve", SLAB, "--sensitivities"]);
    assert!(text.contains("elasticity to") && text.contains("through the closed form"), "{text}");
    let value = json(&["solve", SLAB, "--sensitivities", "--json"]);
    conforms("solve", &value);
    let sensitivities = &value["sensitivities"];
    assert!(sensitivities["disagreement"].as_f64().unwrap() < 1e-12);
    let mass = &sensitivities["parameters"][0];
    assert_eq!(mass["path"], "projectile.mass");
    assert!(mass["critical_velocity"]["elasticity"].as_f64().unwrap() < -0.5);
    assert_eq!(json(&["solve", SLAB, "--json"])["sensitivities"], Value::Null);
    let viscous = json(&["solve", "verification/scenes/viscous.toml", "--sensitivities", "--json"]);
    assert_eq!(viscous["sensitivities"]["disagreement"], Value::Null);
}

#[test]
fn uncertainty_of_the_critical_velocity_repeats_with_its_seed() {
    let arguments = |seed: &'static str| {
        let spreads = ["--spread", "target.strength=10%", "--spread", "projectile.mass=0.02"];
        json(&[&["critical", SLAB, "--json", "--samples", "5000", "--seed", seed][..], &spreads].concat())
    };
    let value = arguments("3");
    conforms("critical", &value);
    let uncertainty = &value["uncertainty"];
    assert_eq!(uncertainty, &arguments("3")["uncertainty"]);
    assert_ne!(uncertainty["mean_m_s"], arguments("4")["uncertainty"]["mean_m_s"]);
    let (first, sampled) = (&uncertainty["first_order_m_s"], &uncertainty["deviation_m_s"]);
    assert!((first.as_f64().unwrap() / sampled.as_f64().unwrap() - 1.0).abs() < 0.1, "{uncertainty}");
    assert_eq!(run(&["critical", SLAB, "--spread", "H/d=0.1"]).0, 2);
    assert_eq!(run(&["critical", SLAB, "--spread", "projectile.mass=-1"]).0, 2);
    assert_eq!(run(&["critical", SLAB, "--samples", "10"]).0, 2);
}

#[test]
fn a_three_layer_scene_solves_sweeps_and_has_sensitivities_of_every_layer() {
    let scene = "verification/scenes/layered.toml";
    assert!(Path::new(scene).exists());
    let value = json(&["solve", scene, "--sensitivities", "--json"]);
    assert!(value["relative_error"]["depth"].as_f64().unwrap() < 1e-13);
    let paths: Vec<_> = value["sensitivities"]["parameters"].as_array().unwrap().iter().map(|p| &p["path"]).collect();
    assert!(paths.contains(&&Value::from("target.layer.2.strength")));
    let swept = json(&["sweep", scene, "--vary", "target.layer.1.strength=0.1MPa:60MPa:5", "--json"]);
    let rows = swept["rows"].as_array().unwrap();
    let speed = |i: usize| rows[i]["critical_velocity_m_s"].as_f64().unwrap();
    assert!((1..5).all(|i| speed(i) > speed(i - 1)));
    let critical = json(&["critical", scene, "--json"]);
    assert!(critical["relative_error"].as_f64().unwrap() < 1e-13);
}
