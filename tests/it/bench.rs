//! `bench` as a person or a script meets it: errors, failed runs, schema, report folder. No time decides a test.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use serde_json::Value;

use crate::program::{conforms, json, run, run_in, scene};

fn bench(options: &str) -> Value {
    run(&format!("bench --repeats 1 --json {options}")).expect(0).json()
}

/// Every part of the bench on one scene, measured once: the folder of the report, and what was printed.
static TUNNEL: LazyLock<(PathBuf, Value)> = LazyLock::new(|| {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("bench-report");
    let parts = "work-precision,step-size,scaling --varied 10 --most 100";
    let report = bench(&format!("@tunnel --out {} --parts {parts}", folder.display()));
    (folder, report)
});

fn runs<'a>(report: &'a Value, scene: &str, method: &str) -> Vec<&'a Value> {
    let mine = |run: &&Value| run["scene"] == scene && run["method"] == method;
    report["runs"].as_array().unwrap().iter().filter(mine).collect()
}

#[test]
fn errors_fall_with_the_tolerance_and_the_fastest_keep_their_level() {
    let (_, report) = &*TUNNEL;
    assert_eq!(runs(report, "tunnel", "closed-form").len(), 1);
    for case in ["tunnel", "varied"] {
        let taylor = runs(report, case, "taylor");
        let error = |setting: &str| {
            let run = taylor.iter().find(|run| run["setting"] == setting).unwrap();
            assert_eq!(run["state"], "right", "{case} at {setting}");
            run["error"].as_f64().unwrap()
        };
        assert!(error("1e-4") < 1e-3 && error("1e-8") < 1e-7 && error("eps") < 1e-15, "{case}");
        assert!(error("eps") < error("1e-4"), "{case}");
    }
    let all = report["runs"].as_array().unwrap();
    for fastest in report["fastest"].as_array().unwrap() {
        let Some(setting) = fastest["setting"].as_str() else { continue };
        let run = all.iter().find(|run| {
            run["scene"] == fastest["scene"] && run["method"] == fastest["method"] && run["setting"] == setting
        });
        let run = run.unwrap();
        assert_eq!(run["state"], "right", "{fastest}");
        assert!(run["error"].as_f64().unwrap() <= fastest["level"].as_f64().unwrap(), "{fastest}");
        assert_eq!(run["time"]["median_ns"], fastest["time_ns"]);
    }
    // The paper's scheme never gets to 1e-12, and no time is invented for it.
    let paper =
        report["fastest"].as_array().unwrap().iter().find(|f| f["method"] == "lagged/step-end" && f["level"] == 1e-12);
    assert!(paper.unwrap()["time_ns"].is_null());
}

#[test]
fn runs_that_are_wrong_refused_or_undecided_are_shown_and_count_at_no_accuracy() {
    let folder = tempfile::tempdir().unwrap();
    let said = run_in(folder.path(), "bench @graze @stiff --repeats 1 --parts work-precision --out report");
    let text_of = |name: &str| fs::read_to_string(folder.path().join("report").join(name)).unwrap();
    let report: Value = serde_json::from_str(&text_of("report.json")).unwrap();
    let state = |run: &Value| run["state"].as_str().unwrap().to_owned();
    // The paper's scheme overlooks the millionth that is left to the far side, and says stopped.
    let paper = runs(&report, "graze", "lagged/step-end");
    let wrong = paper.iter().find(|run| state(run) == "failed").unwrap();
    assert!(wrong["reason"].as_str().unwrap().contains("in place of perforated"), "{wrong}");
    assert!(wrong["error"].is_null() && wrong["failed"] == 1, "{wrong}");
    // At a loose tolerance the margin lies inside the bar.
    assert!(runs(&report, "graze", "taylor").iter().any(|run| state(run) == "undecided"));
    // The energy form refuses viscosity.
    let refused = runs(&report, "stiff", "energy");
    assert!(refused.iter().all(|run| state(run) == "failed" && run["time"].is_null() | run["error"].is_null()));
    for fastest in
        report["fastest"].as_array().unwrap().iter().filter(|f| f["scene"] == "stiff" && f["method"] == "energy")
    {
        assert!(fastest["time_ns"].is_null());
    }
    // The page says how many there are.
    assert_eq!(refused.len(), 15, "{refused:?}");
    let table = text_of("tables/cost-stiff.csv");
    assert!(table.contains("force evaluations of a solution") && table.lines().count() > 30, "{table}");
    assert!(text_of("report.html").contains("15 of 15"));
    // Failures, reasons and the table have room.
    assert_eq!(said.out.lines().find(|line| line.chars().count() > 80 && !line.contains('/')), None);
    assert!(said.out.contains("failed: energy at every setting") && said.out.contains("viscosity"), "{said:?}");
}

#[test]
fn the_largest_steps_follow_the_error_constants_and_the_orders() {
    let (_, report) = &*TUNNEL;
    let studies = report["step_size"].as_array().unwrap();
    let names: Vec<_> = studies.iter().map(|study| study["quantity"].as_str().unwrap()).collect();
    assert_eq!(names, ["depth", "time"]);
    let held = |study: &Value, method: &str| -> Vec<f64> {
        let curves = study["curves"].as_array().unwrap();
        let curve = curves.iter().find(|curve| curve["method"] == method).unwrap();
        curve["held"].as_array().unwrap().iter().map(|held| held["size"].as_f64().unwrap()).collect()
    };
    for boundaries in ["interpolated", "landed"] {
        // First order: a tenth of the error needs a tenth of the step; second order: a third.
        let lagged = held(&studies[0], &format!("lagged/{boundaries}"));
        let centred = held(&studies[0], &format!("centred/{boundaries}"));
        let (first, second) = (lagged[2] / lagged[3], centred[2] / centred[3]);
        assert!((first / 10.0 - 1.0).abs() < 0.02, "lagged/{boundaries}: {first}");
        assert!((second / 10f64.sqrt() - 1.0).abs() < 0.25, "centred/{boundaries}: {second}");
    }
    // The step and the error of `converge` at it: held to within the width of the search.
    let step = held(&studies[0], "lagged/landed")[3];
    let flight = json(&format!("solve @tunnel --method central-difference --events landed --dt {step}"));
    let error = flight["relative_error"]["depth"].as_f64().unwrap();
    assert!((0.99e-5..=1e-5).contains(&error), "{error}");
}

#[test]
fn a_perforation_has_steps_for_time_residual_and_critical_velocity() {
    let report = bench("@perforate --parts step-size");
    let studies = report["step_size"].as_array().unwrap();
    let names: Vec<_> = studies.iter().map(|study| study["quantity"].as_str().unwrap()).collect();
    assert_eq!(names, ["time", "velocity", "critical_velocity"]);
    let adaptive = if cfg!(feature = "diffsol") { 2 } else { 1 };
    for study in studies {
        let curves = study["curves"].as_array().unwrap();
        assert_eq!(curves.len(), 9 + adaptive);
        for curve in curves {
            let held = curve["held"].as_array().unwrap();
            let sizes: Vec<f64> = held.iter().filter_map(|held| held["size"].as_f64()).collect();
            assert!(!sizes.is_empty() && sizes.windows(2).all(|pair| pair[1] <= pair[0]), "{}", curve["method"]);
        }
    }
}

#[test]
fn what_bench_prints_is_what_its_schema_says_and_its_folder_holds_the_same() {
    let (target, report) = &*TUNNEL;
    conforms("bench", report);
    let written: Value = serde_json::from_slice(&fs::read(target.join("report.json")).unwrap()).unwrap();
    assert_eq!(written, *report);
    let growth = report["growth"].as_array().unwrap();
    assert_eq!(growth.iter().map(|g| g["scenes"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 1, 10, 10, 100, 100]);
    assert!(growth.iter().all(|g| g["seconds"].as_f64().unwrap() > 0.0 && g["source"] == "file"));
    let page = fs::read_to_string(target.join("report.html")).unwrap();
    for part in ["Error against time", "The paper's scheme against its step", "Cost as work grows", "penetrode bench"] {
        assert!(page.contains(part), "{part}");
    }
    // Every link of the page leads to a file of the folder, and every figure is shown.
    for link in page.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(link.starts_with('#') || link == "data:," || target.join(link).is_file(), "{link}");
    }
    assert_eq!(fs::read_dir(target.join("figures")).unwrap().count(), page.matches("<figure").count());
}

#[test]
fn a_second_run_replaces_its_own_report_and_nobody_elses() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("report");
    let line = format!("--parts scaling --most 1 --out {}", target.display());
    bench(&line);
    let again = bench(&line);
    let written: Value = serde_json::from_slice(&fs::read(target.join("report.json")).unwrap()).unwrap();
    assert_eq!(written, again);
    fs::write(target.join("report.json"), "{}").unwrap();
    run(&format!("bench @tunnel --out {}", target.display())).refused();
}

#[test]
fn two_scenes_of_one_name_are_two_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("constant-force.toml");
    fs::copy(scene("constant-force"), &other).unwrap();
    // The first by the name of a scene that ships.
    let report = bench(&format!("constant-force {} --parts step-size", other.display()));
    let studies = report["step_size"].as_array().unwrap();
    let mut names: Vec<_> = studies.iter().map(|study| study["scene"].as_str().unwrap()).collect();
    names.dedup();
    assert_eq!(names, ["constant-force", "constant-force-2"]);
}

#[test]
fn a_peer_that_cannot_be_started_is_missing() {
    assert!(run("bench @tunnel --peer no-such-program").expect(5).out.is_empty());
}

#[test]
#[cfg(unix)]
fn a_peer_is_timed_by_its_own_clock_and_judged_like_any_method() {
    let folder = tempfile::tempdir().unwrap();
    // Programs in the shell. The first two greet and answer each question, `$n` being its number.
    let peer = |name: &str, script: &str| {
        let path = folder.path().join(name);
        fs::write(&path, script).unwrap();
        format!("--peer 'sh {}'", path.display())
    };
    let answering = |name: &str, answer: &str| {
        let answer = answer.replace('"', "\\\"");
        let greeting = "read q; echo '{\"name\": \"fake\"}'";
        peer(name, &format!("{greeting}; n=0; while read q; do n=$((n+1)); printf '%s\\n' \"{answer}\"; done"))
    };
    let exact = json("solve @tunnel --method closed-form");
    let (depth, time) = (exact["depth_m"].as_f64().unwrap(), exact["time_s"].as_f64().unwrap());
    let numbers = format!("\"depth_m\": {}, \"time_s\": {time:e}, \"velocity_m_s\": 0", depth * (1.0 + 1e-7));
    let clock = "\"wall_ns\": 5000, \"wall_ns_quartiles\": [4000, 7000]";
    let right = answering("right", &format!("{{\"id\": $n, {numbers}, {clock}}}"));
    let wrong = answering("wrong", &format!("{{\"id\": $n, \"outcome\": \"perforated\", {numbers}, {clock}}}"));
    let timeless = answering("timeless", &format!("{{\"id\": $n, {numbers}}}"));
    let refused = run(&format!("bench @tunnel --parts work-precision {right} {timeless}")).refused();
    assert!(refused.contains("answers without wall_ns"), "{refused}");
    let dies = peer("dies", "read q; echo '{\"name\": \"mortal\"}'; read q");
    let report = bench(&format!("@tunnel --parts work-precision {right} {wrong} {dies}"));
    let right = runs(&report, "tunnel", "fake");
    assert_eq!(right.len(), 12);
    for run in right {
        assert_eq!((run["state"].as_str(), run["quantity"].as_str()), (Some("right"), Some("depth")), "{run}");
        // The depth is off by 1e-7, and its condition number is a few units.
        let error = run["error"].as_f64().unwrap();
        assert!((1e-8..=1.01e-7).contains(&error), "{run}");
        let time = &run["time"];
        assert_eq!((&time["median_ns"], &time["low_ns"], &time["high_ns"]), (&5e3.into(), &4e3.into(), &7e3.into()));
    }
    for (name, reason) in
        [("fake 2", "perforated in place of stopped-in-tunnel"), ("mortal", "ended without an answer")]
    {
        let failed = runs(&report, "tunnel", name);
        assert_eq!(failed.len(), 12);
        for run in failed {
            assert_eq!(run["state"], "failed");
            assert!(run["reason"].as_str().unwrap().contains(reason), "{run}");
        }
    }
    let fastest = report["fastest"].as_array().unwrap();
    let times = |name: &str| -> Vec<bool> {
        fastest.iter().filter(|f| f["method"] == name).map(|f| f["time_ns"].is_number()).collect()
    };
    assert_eq!(times("fake"), [true, true, false, false]);
    assert_eq!(times("fake 2"), [false; 4]);
}
