//! The commands as a person or a script meets them: exit codes, JSON, refusals, files.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

/// Path of a shipped scene.
fn scene(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/scenes").join(format!("{name}.toml")).display().to_string()
}

fn run(arguments: &[&str]) -> Output {
    Command::cargo_bin("penetrode").unwrap().args(arguments).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = run(arguments);
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{arguments:?}: {e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Methods of this build that adapt their steps.
fn adaptive_methods() -> Vec<&'static str> {
    let mut methods = vec!["taylor", "energy"];
    if cfg!(feature = "diffsol") {
        methods.extend(["tsit45", "bdf", "esdirk34", "tr-bdf2", "adaptive"]);
    }
    methods
}

#[test]
fn forrestal_shot_14_reaches_its_published_depth_with_events_in_order() {
    let answer = json(&["solve", &scene("forrestal-1994-shot-14"), "--json"]);
    let ratio = answer["groups"]["X_over_d"].as_f64().unwrap();
    assert!((ratio - 6.215_430).abs() < 1e-6, "{ratio}");
    let events: Vec<_> = answer["events"].as_array().unwrap().iter().map(|e| e["event"].as_str().unwrap()).collect();
    assert_eq!(events, ["crater-end", "rest"]);
    let times: Vec<_> = answer["events"].as_array().unwrap().iter().map(|e| e["time_s"].as_f64().unwrap()).collect();
    assert!(times[0] < times[1]);
}

#[test]
fn a_table_to_audit_may_come_from_standard_input_and_the_scene_not_as_well() {
    let table = "dt_s,depth_m\n1e-6,1.01\n2e-6,1.04\n4e-6,1.16\n8e-6,1.64\n";
    let audit = |arguments: &[&str], input: &str| {
        Command::cargo_bin("penetrode").unwrap().arg("audit").args(arguments).write_stdin(input).output().unwrap()
    };
    let passed = audit(&["-", "--order", "2"], table);
    assert_eq!(code(&passed), 0, "{}", String::from_utf8_lossy(&passed.stderr));
    assert!(String::from_utf8_lossy(&passed.stdout).starts_with("standard input\n"));
    let said = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let refused = audit(&["-"], "dt_s,depth_m\n1e-6\n");
    assert_eq!(code(&refused), 2);
    assert!(said(&refused).starts_with("error: standard input:2: 1 cell"), "{}", said(&refused));
    let both = audit(&["-", "--scene", "-"], table);
    assert_eq!(code(&both), 2);
    assert!(said(&both).contains("cannot both come from standard input"), "{}", said(&both));
}

#[test]
fn a_flight_without_time_and_a_run_without_scenes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = changed_slab(folder.path(), "\"400 m/s\"", "0.0");
    let output = run(&["converge", &path]);
    assert_eq!((code(&output), output.stdout.len()), (2, 0));
    let text = said(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("the flight takes no time") && !text.contains("--dt"), "{text}");
    for arguments in [&["stress", "--cases", "0"][..], &["batch", "random:0", "--out", "-"]] {
        let output = run(arguments);
        assert_eq!((code(&output), output.stdout.len()), (2, 0), "{arguments:?}: {}", said(&output));
    }
}

#[test]
fn a_grazing_perforation_is_never_called_a_stop() {
    for method in adaptive_methods() {
        let answer = json(&["solve", &scene("graze"), "--method", method, "--json"]);
        let outcome = answer["outcome"].as_str().unwrap();
        assert!(outcome == "perforated" || outcome == "undecided", "{method}: {outcome}");
    }
}

#[test]
fn every_method_finds_the_critical_velocity_of_the_slab() {
    let mut limits = vec![("taylor", 1e-13), ("energy", 1e-13), ("closed-form", 1e-13), ("central-difference", 1e-2)];
    if cfg!(feature = "diffsol") {
        limits.extend([("tsit45", 1e-9), ("bdf", 1e-8), ("esdirk34", 1e-7), ("tr-bdf2", 1e-6), ("adaptive", 1e-8)]);
    }
    for (method, limit) in limits {
        let answer = json(&["critical", &scene("paper-slab"), "--method", method, "--json"]);
        let error = answer["relative_error"].as_f64().unwrap();
        assert!(error <= limit, "{method}: {error:e}");
        let flights = answer["evaluations"].as_u64().unwrap();
        assert!(method == "central-difference" || flights <= 12, "{method}: {flights} flights");
        assert!(answer["eq15"]["valid"].as_bool().unwrap());
    }
}

#[test]
fn what_a_command_prints_is_what_its_schema_says() {
    for (command, arguments) in [
        ("solve", vec!["solve", "tunnel"]),
        ("solve", vec!["solve", "perforate"]),
        ("solve", vec!["solve", "stiff"]),
        ("solve", vec!["solve", "layered"]),
        ("solve", vec!["solve", "tunnel", "--method", "central-difference"]),
        ("critical", vec!["critical", "paper-slab"]),
        ("converge", vec!["converge", "tunnel", "--points", "8"]),
        ("converge", vec!["converge", "tunnel", "--method", "taylor", "--points", "8"]),
    ] {
        let schema = json(&["schema", command]);
        let validator = jsonschema::validator_for(&schema).unwrap();
        let path = scene(arguments[1]);
        let mut all = vec![arguments[0], path.as_str()];
        all.extend(&arguments[2..]);
        all.push("--json");
        let answer = json(&all);
        let faults: Vec<_> = validator.iter_errors(&answer).map(|e| e.to_string()).collect();
        assert!(faults.is_empty(), "{arguments:?}: {faults:?}");
        assert_eq!(answer["schema"], format!("penetrode/{command}/1"));
    }
}

#[test]
fn numbers_of_json_read_back_to_the_same_bits() {
    let answer = json(&["solve", &scene("tunnel"), "--json"]);
    let text = answer["depth_m"].to_string();
    assert_eq!(text.parse::<f64>().unwrap().to_bits(), answer["depth_m"].as_f64().unwrap().to_bits());
}

#[test]
fn bad_input_is_refused_with_exit_2_an_underline_and_nothing_on_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.toml");
    let text = fs::read_to_string(scene("tunnel")).unwrap().replace("\"2 kg\"", "\"2 m\"");
    fs::write(&bad, text).unwrap();
    let trajectory = folder.path().join("path.csv");
    let output = run(&["solve", bad.to_str().unwrap(), "--json", "--trajectory", trajectory.to_str().unwrap()]);
    assert_eq!(code(&output), 2);
    assert!(output.stdout.is_empty());
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("bad.toml:6:11"), "{message}");
    assert!(message.contains("mass"), "{message}");
    assert!(!trajectory.exists());
}

#[test]
fn options_that_a_method_does_not_use_are_refused() {
    for arguments in [
        vec!["--method", "taylor", "--dt", "1us"],
        vec!["--method", "taylor", "--velocity", "centred"],
        vec!["--method", "central-difference", "--rtol", "1e-6"],
        vec!["--method", "closed-form", "--rtol", "1e-6"],
        vec!["--method", "taylor", "--rtol", "nan"],
        vec!["--method", "taylor", "--rtol", "1e-20"],
        vec!["--method", "central-difference", "--dt", "-1"],
        vec!["--method", "central-difference", "--dt", "1 kg"],
        vec!["--method", "runge-kutta"],
    ] {
        let path = scene("tunnel");
        let mut all = vec!["solve", path.as_str()];
        all.extend(&arguments);
        let output = run(&all);
        assert_eq!(code(&output), 2, "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(!output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn a_viscous_stage_is_refused_by_the_energy_form_with_the_reason() {
    let output = run(&["solve", &scene("viscous"), "--method", "energy"]);
    assert_eq!(code(&output), 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("visc"));
}

#[test]
fn a_critical_velocity_needs_a_far_side() {
    assert_eq!(code(&run(&["critical", &scene("tunnel")])), 2);
}

#[test]
fn a_step_beyond_the_stability_limit_exits_3_and_still_shows_the_flight() {
    let output = run(&["solve", &scene("crater"), "--method", "central-difference", "--dt", "2 ms", "--json"]);
    assert_eq!(code(&output), 3);
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["method"]["stability"]["stable"], false);
    assert!(answer["depth_m"].is_number());
}

#[test]
fn a_flight_without_an_end_exits_1_with_the_state_reached_in_json() {
    let text = "[projectile]\nmass = 1\n[[stage]]\ndrag = 1\n[impact]\nvelocity = 10\n";
    let output =
        Command::cargo_bin("penetrode").unwrap().args(["solve", "-", "--json"]).write_stdin(text).output().unwrap();
    assert_eq!(code(&output), 1);
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["schema"], "penetrode/solve/1");
    assert!(answer["error"]["message"].as_str().unwrap().contains("never ends"));
}

#[test]
fn a_trajectory_has_a_row_for_each_step_and_event() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("path.csv");
    let answer = json(&["solve", &scene("tunnel"), "--json", "--trajectory", path.to_str().unwrap()]);
    let text = fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time_s,depth_m,velocity_m_s,force_n,stage"));
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert!(rows.windows(2).all(|pair| pair[0][0] <= pair[1][0]), "times do not fall");
    let last = rows.last().unwrap();
    assert_eq!(last[1], answer["depth_m"].as_f64().unwrap());
    assert_eq!(last[0], answer["time_s"].as_f64().unwrap());
}

#[test]
fn a_crater_flight_builds_no_tunnel() {
    let crater = json(&["solve", &scene("crater"), "--json"]);
    let notes = crater["skipped"].to_string();
    assert!(notes.contains("stage 1"), "{notes}");
    let tunnel = json(&["solve", &scene("tunnel"), "--json"]);
    let evaluations = |answer: &Value| answer["cost"]["force_evaluations"].as_u64().unwrap();
    assert!(evaluations(&crater) < evaluations(&tunnel), "{} {}", evaluations(&crater), evaluations(&tunnel));
}

#[test]
fn a_driven_stage_is_flown_implicitly_at_a_tenth_of_the_explicit_cost() {
    if !cfg!(feature = "diffsol") {
        return;
    }
    let evaluations = |scene_name: &str, method: &str| {
        json(&["solve", &scene(scene_name), "--method", method, "--rtol", "1e-6", "--json"])["cost"]["force_evaluations"]
            .as_u64()
            .unwrap()
    };
    let (explicit, adaptive) = (evaluations("stiff", "tsit45"), evaluations("stiff", "adaptive"));
    assert!(10 * adaptive <= explicit, "{adaptive} against {explicit}");
    // A stage that only resists stays explicit, viscous or not.
    assert_eq!(evaluations("viscous", "adaptive"), evaluations("viscous", "tsit45"));
}

#[test]
fn nobodys_folder_is_replaced_by_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("precious");
    fs::create_dir(&target).unwrap();
    fs::write(target.join("thesis.txt"), "years of work").unwrap();
    let output = run(&["verify", "--only", "eq15", "--out", target.to_str().unwrap()]);
    assert_eq!(code(&output), 2);
    assert_eq!(fs::read_to_string(target.join("thesis.txt")).unwrap(), "years of work");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_suite_of_ones_own_runs_on_ones_own_scene() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(scene("tunnel"), folder.path().join("mine.toml")).unwrap();
    let suite = folder.path().join("suite.toml");
    let text = r#"
        title = "mine"
        [[claim]]
        id = "mine"
        statement = "my scene is solved"
        check = { agreement = {} }
        scenes = ["mine.toml"]
        methods = ["taylor"]
        quantities = ["depth"]
        limit = 1e-3
        reason = "good enough for me"
    "#;
    fs::write(&suite, text).unwrap();
    let out: PathBuf = folder.path().join("report");
    let output = run(&["verify", suite.to_str().unwrap(), "--out", out.to_str().unwrap(), "--json"]);
    assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["counts"]["passed"], 1);
    assert!(out.join("report.json").exists());
    // Far looser than what is measured: a warning, no more.
    assert!(String::from_utf8_lossy(&output.stderr).contains("guards"));
    // And an impossible limit is a failed criterion, with the report written all the same.
    fs::write(&suite, text.replace("1e-3", "1e-30").replace("\"time\"", "\"depth\"")).unwrap();
    let strict = run(&["verify", suite.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!([0, 3].contains(&code(&strict)));
}

#[test]
fn a_suite_with_a_mistake_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let suite = folder.path().join("suite.toml");
    fs::write(&suite, "title = \"x\"\n[[claim]]\nid = \"a\"\nstatemnt = \"b\"\n").unwrap();
    let output = run(&["verify", suite.to_str().unwrap(), "--out", folder.path().join("r").to_str().unwrap()]);
    assert_eq!(code(&output), 2);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("suite.toml:4"), "{message}");
    assert!(!folder.path().join("r").exists());
}

#[test]
fn bad_convergence_data_never_passes() {
    let folder = tempfile::tempdir().unwrap();
    let table = |rows: &[(f64, f64)]| {
        let mut text = String::from("dt_s,depth_m\n");
        for (dt, x) in rows {
            text.push_str(&format!("{dt},{x}\n"));
        }
        let path = folder.path().join("table.csv");
        fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let steps = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125];
    let rows = |f: &dyn Fn(f64) -> f64| steps.iter().map(|&h| (h, f(h))).collect::<Vec<_>>();
    let exit = |rows: &[(f64, f64)]| code(&run(&["audit", &table(rows)]));
    assert_eq!(exit(&rows(&|h| 1.0 + 0.1 * h * h)), 0, "second order converges");
    assert_eq!(exit(&rows(&|h| 1.0 + 0.01 / h)), 3, "diverging");
    assert_eq!(exit(&rows(&|_| 1.0)), 4, "constant");
    assert_eq!(exit(&rows(&|h| if h < 0.2 { f64::NAN } else { 1.0 + h })), 3, "not a number");
    assert_eq!(exit(&[(1.0, 1.0), (0.5, 1.1)]), 2, "two points");
    assert_eq!(exit(&[(1.0, 1.0), (1.0, 1.2), (0.5, 1.1), (0.25, 1.05), (0.125, 1.02)]), 2, "one step, two values");
}

#[test]
fn help_and_completion_are_there_for_every_command() {
    for command in ["solve", "critical", "converge", "audit", "bench", "verify", "schema", "completions"] {
        let output = run(&[command, "--help"]);
        assert_eq!(code(&output), 0, "{command}");
        let text = String::from_utf8(output.stdout).unwrap();
        let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
        assert!(widest <= 80, "{command}: a line of {widest} characters");
    }
    for shell in ["bash", "zsh", "fish"] {
        assert!(run(&["completions", shell]).stdout.len() > 1000, "{shell}");
    }
    assert_eq!(code(&run(&[])), 2);
}

/// What is on standard error.
fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Commands on the shipped scenes and data, each with what a person may add to see more.
fn commands_for_people() -> Vec<Vec<String>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/scenes");
    let mut commands: Vec<Vec<String>> = Vec::new();
    let mut add = |words: &[&str]| commands.push(words.iter().map(|word| (*word).to_owned()).collect());
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path().display().to_string();
        add(&["solve", &path, "--explain", "--sensitivities"]);
        for method in adaptive_methods().into_iter().chain(["central-difference", "closed-form"]) {
            add(&["solve", &path, "--explain", "--method", method]);
        }
        add(&["critical", &path]);
        add(&["critical", &path, "--spread", "projectile.mass=5%", "--samples", "100"]);
        add(&["converge", &path, "--points", "12"]);
        add(&["converge", &path, "--points", "8", "--method", "energy"]);
        add(&["sweep", &path, "--vary", "projectile.mass=1:3:3"]);
        add(&["sweep", &path, "--vary", "H/d=0.5:18:5", "--vary", "resistance.S=8:16:3:log"]);
    }
    add(&["map"]);
    add(&["experiments"]);
    add(&["experiments", "--spread", "target.strength=10%"]);
    add(&["verify", "--only", "eq15"]);
    commands
}

#[test]
fn no_line_for_people_is_longer_than_eighty_columns() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in commands_for_people() {
        let output = Command::cargo_bin("penetrode").unwrap().args(&arguments).current_dir(&folder).output().unwrap();
        for text in [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()) {
            // Where the file itself is quoted its path is whole, however long.
            let is_long = |line: &&str| line.chars().count() > 80 && !line.contains('/');
            assert_eq!(text.lines().find(is_long), None, "{arguments:?}");
        }
    }
}

#[test]
fn a_scene_without_a_critical_velocity_converges_without_it() {
    let answer = json(&["converge", &scene("stiff"), "--method", "central-difference", "--json"]);
    assert!(answer["quantities"].as_array().unwrap().iter().all(|q| q["quantity"] != "critical_velocity"));
    assert!(answer["skipped"][0].as_str().unwrap().contains("perforated at any speed"), "{answer}");
    let answer = json(&["critical", &scene("stiff"), "--spread", "projectile.mass=5%", "--json"]);
    assert_eq!((answer["critical_velocity_m_s"].as_f64(), &answer["uncertainty"]), (Some(0.0), &Value::Null));
    assert!(answer["skipped"][0].as_str().unwrap().contains("V_c is 0"), "{answer}");
}

/// A slab with `from` replaced by `to`, in a file of its own.
fn changed_slab(folder: &Path, from: &str, to: &str) -> String {
    let text = fs::read_to_string(scene("perforate")).unwrap();
    assert!(text.contains(from), "{text}");
    let path = folder.join("changed.toml");
    fs::write(&path, text.replace(from, to)).unwrap();
    path.display().to_string()
}

#[test]
fn numbers_at_the_ends_of_the_range_are_short_and_never_nan() {
    let folder = tempfile::tempdir().unwrap();
    let thin = |to: &str| changed_slab(folder.path(), "\"180 mm\"", to);
    let slow = |to: &str| changed_slab(folder.path(), "\"400 m/s\"", to);
    let soft = |to: &str| changed_slab(folder.path(), "S = 12.0", to);
    let mut said = Vec::new();
    for thickness in ["0", "1e-300", "1e300"] {
        said.push(run(&["critical", &thin(thickness)]));
    }
    for velocity in ["1e-200", "1e150", "1e300", "1e-300"] {
        said.push(run(&["solve", &slow(velocity), "--explain"]));
    }
    for factor in ["S = 1e-300", "S = 1e300", "S = 1e-310"] {
        said.push(run(&["solve", &soft(factor), "--explain"]));
        said.push(run(&["critical", &soft(factor)]));
    }
    for output in said {
        let text = String::from_utf8(output.stdout).unwrap() + &String::from_utf8(output.stderr).unwrap();
        assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
        let is_number = |word: &str| word.contains(|c: char| c.is_ascii_digit());
        assert!(
            text.split_whitespace().all(|word| !is_number(word) || word.len() < 40 || word.contains('/')),
            "{text}"
        );
    }
    let slow = run(&["solve", &slow("1e-200")]);
    assert!(!String::from_utf8(slow.stdout).unwrap().contains("I 0 "), "an impact function above zero");
}

#[test]
fn the_search_for_a_critical_velocity_beyond_the_numbers_ends_with_its_cause() {
    let folder = tempfile::tempdir().unwrap();
    // V_c² grows as e^(2 Q H/M): at 100 km of concrete it leaves the range of the numbers.
    let path = changed_slab(folder.path(), "\"180 mm\"", "\"100 km\"");
    let output = run(&["critical", &path]);
    let text = said(&output);
    assert_eq!((code(&output), output.stdout.len()), (1, 0), "{text}");
    assert!(text.contains("no critical velocity up to"), "{text}");
    let answer = json(&["critical", &path, "--json"]);
    assert!(answer["error"]["message"].as_str().unwrap().contains("no critical velocity up to"));
}

#[test]
fn a_critical_velocity_inside_its_error_bar_is_undecided_and_not_a_number() {
    let folder = tempfile::tempdir().unwrap();
    // The closed form knows the margin to some ulp of V0², of which the drag leaves 1e-30.
    let path = changed_slab(folder.path(), "\"180 mm\"", "\"25 m\"");
    let asked = ["critical", &path, "--method", "closed-form"];
    let output = run(&asked);
    let text = said(&output);
    assert_eq!((code(&output), output.stdout.len()), (4, 0), "{text}");
    assert!(text.contains("V_c is undecided") && text.contains("--method taylor"), "{text}");
    let answer = json(&[&asked[..], &["--json"]].concat());
    assert!(answer["error"]["message"].as_str().unwrap().contains("V_c is undecided"));
    for method in ["taylor", "energy"] {
        let answer = json(&["critical", &path, "--method", method, "--json"]);
        assert!(answer["relative_error"].as_f64().unwrap() < 1e-12, "{answer}");
    }
}

#[test]
fn an_option_is_repeated_as_it_was_typed() {
    let path = scene("tunnel");
    for (arguments, words) in [
        (vec!["--velocity", "centred"], "--velocity = centred is not allowed"),
        (vec!["--events", "step-end"], "--events = step-end is not allowed"),
        (vec!["--dt", "1 us"], "--dt = 1 us is not allowed"),
        (vec!["--method", "central-difference", "--dt", "-1 us"], "--dt = -1 us is not allowed"),
        (vec!["--method", "central-difference", "--dt", "0"], "--dt = 0 is not allowed"),
        (vec!["--rtol", "-1e-3"], "--rtol = -0.001 is not allowed"),
        (vec!["--rtol", "1e-300"], "--rtol = 1e-300 is not allowed"),
    ] {
        let output = run(&[&["solve", &path], &arguments[..]].concat());
        let text = said(&output);
        assert_eq!(code(&output), 2, "{text}");
        assert!(text.contains(words), "{text}");
    }
    for arguments in [["map", "--k", "-1"], ["experiments", "--k", "-1"]] {
        let text = said(&run(&arguments));
        assert!(!text.contains("unexpected argument") && text.contains("-1"), "{text}");
    }
}

#[test]
fn an_order_to_audit_for_is_one_that_a_study_can_tell() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("t.csv");
    fs::write(&table, "dt_s,depth_m\n8,1.64\n4,1.16\n2,1.04\n1,1.01\n").unwrap();
    let table = table.to_str().unwrap();
    for order in ["-1", "0", "1e-3", "33", "1e300", "nan", "inf"] {
        let output = run(&["audit", table, "--order", order]);
        let text = said(&output);
        assert_eq!(code(&output), 2, "{order}");
        assert!(text.contains("a number from 0.1 to 32") && text.len() < 300, "{text}");
    }
    assert_eq!(code(&run(&["audit", table, "--order", "2"])), 0);
}

#[test]
fn what_audit_prints_is_as_its_schema_says() {
    let schema: Value = serde_json::from_slice(&run(&["schema", "audit"]).stdout).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("t.csv");
    for rows in ["8,1.64\n4,1.16\n2,1.04\n1,1.01\n", "8,nan\n4,1.16\n2,inf\n1,1.01\n", "8,1\n4,1\n2,1\n1,1\n1,1\n"] {
        fs::write(&table, format!("dt_s,depth_m\n{rows}")).unwrap();
        let answer = json(&["audit", table.to_str().unwrap(), "--json"]);
        let errors: Vec<_> = validator.iter_errors(&answer).map(|error| error.to_string()).collect();
        assert!(errors.is_empty(), "{rows}: {errors:?}");
    }
}

#[test]
fn a_table_without_rows_is_done_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("t.csv");
    fs::write(&table, "mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,velocity_m_s\n").unwrap();
    let output = run(&["batch", table.to_str().unwrap(), "--out", "-"]);
    assert_eq!(code(&output), 0);
    let said = said(&output);
    assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), 1);
    assert!(said.contains("0 rows"), "{said}");
}
