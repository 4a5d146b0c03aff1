//! Sweeps, map, measured data, sensitivities and uncertainty, as typed on a command line.

#![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::program::{Said, conforms, json, run, run_in};

fn text_of(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_sweep_of_thickness_writes_its_table_and_figures_4_and_5() {
    let folder = TempDir::new().unwrap();
    let text = run_in(folder.path(), "sweep @paper-slab --vary H/d=0.5:18:36 --out fig4.csv").expect(0).out;
    assert!(text.contains("N = 38.58") && text.contains("1.24"), "{text}");
    let table = text_of(&folder, "fig4.csv");
    let mut lines = table.lines();
    let contract = "H/d,outcome,depth_m,velocity_m_s,critical_velocity_m_s,critical_energy_j,dimensionless_energy,\
                    eq15_printed,eq15_unrounded,error";
    assert!(lines.next().unwrap().starts_with(contract));
    assert_eq!(lines.clone().count(), 36);
    assert!(lines.clone().next().unwrap().starts_with("0.5,") && lines.next_back().unwrap().starts_with("18,"));
    for (name, words) in [("fig4.svg", "simulation, full depth"), ("fig4-difference.svg", "difference [%]")] {
        let svg = text_of(&folder, name);
        assert!(svg.starts_with("<?xml") && svg.trim_end().ends_with("</svg>") && svg.contains(words), "{name}");
    }
}

#[test]
fn two_axes_with_units_give_every_pair_and_say_that_s_follows() {
    let folder = TempDir::new().unwrap();
    let sweep = "sweep @paper-slab --vary target.strength=20MPa:60MPa:3:log --vary H/d=2:8:4";
    let value = json(sweep);
    conforms("sweep", &value);
    assert_eq!(value["rows"].as_array().unwrap().len(), 12);
    assert_eq!(value["static_factor_follows_strength"], true);
    let said = run_in(folder.path(), &format!("{sweep} --out two.csv")).expect(0);
    assert!(said.out.contains("resistance.S follows target.strength by Eq. 14"), "{said:?}");
    let svg = text_of(&folder, "two.svg");
    assert!(svg.contains("H/d = 8") && svg.contains("target.strength [Pa]"));
}

#[test]
fn measured_points_stand_beside_the_curves_at_their_own_thickness() {
    let folder = TempDir::new().unwrap();
    let sweep = |points: &str| {
        fs::write(folder.path().join("points.csv"), format!("H/d,E_c/(d3 fc)\n{points}\n")).unwrap();
        run_in(folder.path(), "sweep @paper-slab --vary H/d=1:18:5 --data points.csv --out fig4.csv --json")
    };
    let value = sweep("3,10\n12.5,100").expect(0).json();
    let data = value["data"].as_array().unwrap();
    assert_eq!((data.len(), &data[1]["measured"]), (2, &Value::from(100.0)));
    let alone = json("sweep @paper-slab --vary H/d=12.5:12.5:1");
    assert_eq!(data[1]["energy_full_depth"], alone["rows"][0]["energy_full_depth"]);
    assert!(text_of(&folder, "fig4.svg").contains("measured"));
    let refused = sweep("3,ten").refused();
    assert!(refused.contains("points.csv:2, column 2: `ten` in"), "{refused}");
}

#[test]
fn a_bad_row_keeps_its_message_and_the_exit_code_is_3() {
    let folder = TempDir::new().unwrap();
    let said = run_in(folder.path(), "sweep @paper-slab --vary projectile.mass=-1kg:1kg:3 --out t.csv").expect(3);
    assert!(said.err.contains("2 of 3 points have no answer"), "{said:?}");
    let table = text_of(&folder, "t.csv");
    assert!(table.lines().nth(1).unwrap().contains("mass") && table.lines().count() == 4, "{table}");
}

#[test]
fn scenes_outside_eq_11_12_are_warned_of_on_standard_error_alone() {
    for command in ["solve", "critical"] {
        let Said { out, err, .. } = run(&format!("{command} @paper-slab")).expect(0);
        assert!(err.contains("outside Eq. 11-12") && !out.contains("outside Eq. 11-12"), "{err}");
        let inside = run(&format!("{command} @perforate-no-drag"));
        assert!(!inside.err.contains("Eq. 11-12"), "{inside:?}");
    }
}

#[test]
fn the_report_of_the_suite_shows_measured_points_with_the_curve_or_refuses_them() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("points.csv"), "H/d,E_c/(d3 fc)\n5,30.5\n10,80\n").unwrap();
    run_in(folder.path(), "verify --only sweep/ --data points.csv --out report").expect(0);
    let table = text_of(&folder, "report/tables/critical-energy.csv");
    let point = "\n\"critical impact energy\",measured,\"H/d\",5,\"E_c/(d³ f_c)\",30.5\n";
    assert!(table.contains(point), "{table:.300}");
    let page = text_of(&folder, "report/report.html");
    assert!(page.contains("measured</text>") && page.contains("--data "));
    // Nothing of the suite sweeps H/d: the points would be shown nowhere.
    let said = run_in(folder.path(), "verify --only nose/ --data points.csv --out none").expect(2);
    assert!(said.err.contains("--data") && !folder.path().join("none").exists(), "{said:?}");
}

#[test]
fn the_map_has_lines_of_three_errors_and_the_measured_scenes() {
    let folder = TempDir::new().unwrap();
    let value = run_in(folder.path(), "map --out map.csv --json").expect(0).json();
    conforms("map", &value);
    assert_eq!(value["lines"].as_array().unwrap().len(), 6);
    assert_eq!(value["scenes"].as_array().unwrap().len(), 105);
    let svg = text_of(&folder, "map.svg");
    for words in ["Eq. 11 too shallow", "Eq. 12 too deep", "20\u{a0}%", "Sliter1980"] {
        assert!(svg.contains(words), "{words}");
    }
    assert!(text_of(&folder, "map.csv").starts_with("level,I,N\n0.01,"));
}

#[test]
fn shipped_experiments_say_what_they_validate_and_what_is_not_given() {
    let folder = TempDir::new().unwrap();
    let text = run_in(folder.path(), "experiments --out exp.csv").expect(0).out;
    for words in ["Forrestal1994", "not given", "critical velocity", "13 kg", "u_val² = u_num² + u_input² + u_D²"] {
        assert!(text.contains(words), "{words}\n{text}");
    }
    assert!(text_of(&folder, "exp.svg").contains("±20 %"));
    conforms("experiments", &json("experiments"));
}

#[test]
fn a_table_of_ones_own_works_the_same_way_and_its_errors_have_a_place() {
    let folder = TempDir::new().unwrap();
    let of = |row: &str, line: &str| {
        let header = "V0_m_s,depth_mm,M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,depth_uncertainty_mm,colour";
        fs::write(folder.path().join("own.csv"), format!("{header}\n{row}\n")).unwrap();
        run_in(folder.path(), line)
    };
    let line = "experiments own.csv --spread target.strength=5% --json";
    let value = of("277,173,0.906,26.9,ogive,2,35.2,2370,4,red", line).expect(0).json();
    conforms("experiments", &value);
    assert_eq!((&value["sets"][0]["set"], &value["meaning"]), (&Value::from("own"), &Value::Null));
    assert!(number(&value["shots"][0]["validation_uncertainty_m"]) > 0.004);
    let same = json("experiments verification/experiments/huang2011_penetration.csv");
    assert_eq!(same["sets"][0]["shots"], 8);
    let refused = of("277,173,0.906,26.9,blunt,2,35.2,2370,,", "experiments own.csv").refused();
    assert!(refused.contains("own.csv:2, column 5: `blunt` in `nose`"), "{refused}");
}

#[test]
fn sensitivities_stand_in_table_and_json_only_when_asked_for() {
    let text = run("solve @paper-slab --sensitivities").out;
    assert!(text.contains("elasticity to") && text.contains("through the closed form"), "{text}");
    let value = json("solve @paper-slab --sensitivities");
    conforms("solve", &value);
    let sensitivities = &value["sensitivities"];
    assert!(number(&sensitivities["disagreement"]) < 1e-12);
    let mass = &sensitivities["parameters"][0];
    assert_eq!(mass["path"], "projectile.mass");
    assert!(number(&mass["critical_velocity"]["elasticity"]) < -0.5);
    assert_eq!(json("solve @paper-slab")["sensitivities"], Value::Null);
    assert_eq!(json("solve @viscous --sensitivities")["sensitivities"]["disagreement"], Value::Null);
}

#[test]
fn uncertainty_of_the_critical_velocity_repeats_with_its_seed() {
    let spread = "--samples 5000 --spread target.strength=10% --spread projectile.mass=0.02";
    let of_seed = |seed: u32| json(&format!("critical @paper-slab {spread} --seed {seed}"));
    let value = of_seed(3);
    conforms("critical", &value);
    let uncertainty = &value["uncertainty"];
    assert_eq!(uncertainty, &of_seed(3)["uncertainty"]);
    assert_ne!(uncertainty["mean_m_s"], of_seed(4)["uncertainty"]["mean_m_s"]);
    let ratio = number(&uncertainty["first_order_m_s"]) / number(&uncertainty["deviation_m_s"]);
    assert!((ratio - 1.0).abs() < 0.1, "{uncertainty}");
}

#[test]
fn a_three_layer_scene_solves_sweeps_and_has_sensitivities_of_every_layer() {
    let value = json("solve @layered --sensitivities");
    assert!(number(&value["relative_error"]["depth"]) < 1e-13);
    let paths: Vec<_> = value["sensitivities"]["parameters"].as_array().unwrap().iter().map(|p| &p["path"]).collect();
    assert!(paths.contains(&&Value::from("target.layer.2.strength")));
    let swept = json("sweep @layered --vary target.layer.1.strength=0.1MPa:60MPa:5");
    let speed = |i: usize| number(&swept["rows"][i]["critical_velocity_m_s"]);
    assert!((1..5).all(|i| speed(i) > speed(i - 1)));
    assert!(number(&json("critical @layered")["relative_error"]) < 1e-13);
}
