//! The commands as a person or a script meets them: exit codes, JSON, refusals, files.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::Path;

use penetrode::integrators::{Accuracy, MethodName};
use serde_json::Value;

use crate::program::{Said, conforms, json, names, run, run_in, run_with, scene};

#[test]
fn forrestal_shot_14_reaches_its_published_depth_with_events_in_order() {
    let answer = json("solve @forrestal-1994-shot-14");
    let ratio = answer["groups"]["X_over_d"].as_f64().unwrap();
    assert!((ratio - 6.215_430).abs() < 1e-6, "{ratio}");
    let [end, rest] = answer["events"].as_array().unwrap().as_slice() else { panic!("{answer}") };
    assert_eq!((&end["event"], &rest["event"]), (&"crater-end".into(), &"rest".into()));
    assert!(end["time_s"].as_f64() < rest["time_s"].as_f64());
}

#[test]
fn a_table_to_audit_may_come_from_standard_input_and_the_scene_not_as_well() {
    let table = "dt_s,depth_m\n1e-6,1.01\n2e-6,1.04\n4e-6,1.16\n8e-6,1.64\n";
    assert!(run_with(table, "audit - --order 2").expect(0).out.starts_with("standard input\n"));
    let refused = run_with("dt_s,depth_m\n1e-6\n", "audit -").refused();
    assert!(refused.starts_with("error: standard input:2: 1 cell"), "{refused}");
    let both = run_with(table, "audit - --scene -").refused();
    assert!(both.contains("cannot both come from standard input"), "{both}");
}

/// The files hold the last lines of runs of the lagged scheme through the scene `perforate`, in the layouts of the codes.
#[test]
fn histories_of_other_codes_are_a_table_of_their_ends() {
    let folder = tempfile::tempdir().unwrap();
    let runs = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/runs");
    for entry in fs::read_dir(runs).unwrap().map(Result::unwrap) {
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    let audit = |file: &dyn Fn(u32) -> String, rest: &str| {
        let all: Vec<_> = [8, 4, 2, 1].iter().map(|&us| format!("--run {}={us}us", file(us))).collect();
        run_in(folder.path(), &format!("audit {} {rest}", all.join(" ")))
    };
    // By hand, from the lines with all their digits.
    let velocities = [134.907_052, 134.806_259, 134.606_417, 134.222_257];
    for (file, rest, digits) in [
        (&|us| format!("abaqus-{us}us.rpt"), "", 1e-3),
        (&|us| format!("rbdout-{us}us"), "--units mm,ms", 0.02),
        (&|us| format!("nodout-{us}us"), "--id 11", 0.02),
    ] as [(&dyn Fn(u32) -> String, &str, f64); 3]
    {
        let answer = audit(file, &format!("--thickness 180mm --json {rest}")).json();
        let quantities = answer["quantities"].as_array().unwrap();
        let names: Vec<_> = quantities.iter().map(|quantity| quantity["quantity"].as_str().unwrap()).collect();
        assert_eq!(names, ["time", "velocity"]);
        for (point, velocity) in quantities[1]["points"].as_array().unwrap().iter().zip(velocities) {
            assert!((point["value"].as_f64().unwrap() - velocity).abs() < digits, "{rest}: {point}, {velocity}");
        }
        for (point, us) in quantities[0]["points"].as_array().unwrap().iter().zip([1.0, 2.0, 4.0, 8.0]) {
            assert_eq!(point["dt_s"].as_f64(), Some(us * 1e-6));
        }
    }
    let answer = audit(&|us| format!("rbdout-{us}us"), "--units mm,ms --scene @perforate --json").json();
    conforms("audit", &answer);
    let scheme = &answer["scheme"]["candidates"][0];
    assert_eq!((&scheme["velocity"], &scheme["events"]), (&"lagged".into(), &"interpolated".into()));
    for (file, rest, cause) in [
        ("abaqus-8us.rpt", "", "does not come to its end: 129.1475 m/s at 0.1814744 m"),
        ("nodout-8us", "--thickness 0.18", "there are several bodies, 11 and 12"),
        ("nodout-8us", "--thickness 0.18 --id 13", "there is no body 13"),
        ("abaqus-8us.rpt", "--thickness 0.18 --units ms,mm", "`ms` is no unit of length"),
        ("missing", "--thickness 0.18", "missing"),
    ] {
        let refused = run_in(folder.path(), &format!("audit --run {file}=8us --run {file}=4us {rest}"));
        let words = refused.refused();
        assert!(words.contains(cause), "{words}");
    }
}

#[test]
fn every_method_finds_the_critical_velocity_of_the_slab() {
    for method in MethodName::built() {
        let limit = match (method, method.accuracy()) {
            (MethodName::Tsit45, _) => 1e-9,
            (MethodName::Bdf | MethodName::Adaptive, _) => 1e-8,
            (MethodName::Esdirk34, _) => 1e-7,
            (_, Accuracy::Tolerance) => 1e-6,
            (_, Accuracy::RoundOff | Accuracy::Exact) => 1e-13,
            (_, Accuracy::Step) => 1e-2,
        };
        let answer = json(&format!("critical @paper-slab --method {method}"));
        let error = answer["relative_error"].as_f64().unwrap();
        assert!(error <= limit, "{method}: {error:e}");
        let flights = answer["evaluations"].as_u64().unwrap();
        assert!(method.accuracy() == Accuracy::Step || flights <= 12, "{method}: {flights} flights");
        assert!(answer["eq15"]["valid"].as_bool().unwrap());
    }
}

#[test]
fn an_enclosure_holds_the_closed_form() {
    for scene in ["tunnel", "perforate", "crater", "layered", "viscous", "constant-force", "air-gap"] {
        let answer = json(&format!("solve @{scene} --method enclosure"));
        for field in ["depth_m", "time_s", "velocity_m_s"] {
            let [low, high, exact] =
                [&answer["enclosure"][field][0], &answer["enclosure"][field][1], &answer["closed_form"][field]]
                    .map(|number| number.as_f64().unwrap());
            // The closed form is that of the numbers as rounded.
            let rounding = 64.0 * f64::EPSILON * exact.abs();
            assert!(
                low - rounding <= exact && exact <= high + rounding,
                "{scene}: {field} {exact} and {low} to {high}"
            );
            assert!(high - low <= 64.0 * f64::EPSILON * exact.abs(), "{scene}: {field} from {low} to {high}");
        }
        let events = answer["enclosure"]["events"].as_array().unwrap();
        assert_eq!(events.len(), answer["events"].as_array().unwrap().len());
    }
}

#[test]
fn one_end_of_an_enclosed_critical_velocity_stops_and_the_other_perforates() {
    let by_ndrc = "--set perforation.criterion=ndrc";
    for (scene, more) in [("paper-slab", by_ndrc), ("thin-slab", by_ndrc), ("layered", ""), ("law-speed-table", "")] {
        let answer = json(&format!("critical @{scene} --method enclosure {more}"));
        let [low, high] = [0, 1].map(|end| answer["enclosure"]["critical_velocity_m_s"][end].as_f64().unwrap());
        assert!(low < high && high - low <= 2.0 * f64::EPSILON * high, "{scene}: {low} to {high}");
        // In a file a speed is the decimal that is written, half a spacing away.
        for (speed, ends) in [(low.next_down(), "stop"), (high.next_up(), "perforated")] {
            let answer = json(&format!("solve @{scene} --method enclosure {more} --set impact.velocity={speed:e}"));
            assert!(
                answer["outcome"].as_str().unwrap().starts_with(ends),
                "{scene} at {speed} m/s: {}",
                answer["outcome"]
            );
        }
    }
}

#[test]
fn what_cannot_be_enclosed_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let words = run_in(folder.path(), "solve tunnel --method enclosure --set impact.velocity=1e-101").refused();
    assert!(words.contains("numbers from 1e-100 to 1e100"), "{words}");
}

#[test]
fn what_a_command_prints_is_what_its_schema_says() {
    for (command, rest) in [
        ("solve", "@tunnel"),
        ("solve", "@perforate"),
        ("solve", "@stiff"),
        ("solve", "@layered"),
        ("solve", "@tunnel --method central-difference"),
        ("critical", "@paper-slab"),
        ("solve", "@graze --method enclosure"),
        ("critical", "@paper-slab --method enclosure"),
        ("sweep", "@paper-slab --vary H/d=1:3:2 --method enclosure"),
        ("converge", "@tunnel --points 8"),
        ("converge", "@tunnel --method taylor --points 8"),
    ] {
        conforms(command, &json(&format!("{command} {rest}")));
    }
    for rows in ["8,1.64\n4,1.16\n2,1.04\n1,1.01\n", "8,nan\n4,1.16\n2,inf\n1,1.01\n", "8,1\n4,1\n2,1\n1,1\n1,1\n"] {
        for scene in ["", "--scene @tunnel"] {
            conforms("audit", &run_with(&format!("dt_s,depth_m\n{rows}"), &format!("audit - --json {scene}")).json());
        }
    }
}

#[test]
fn every_command_that_reads_scenes_takes_settings() {
    for line in ["solve @S", "critical @S", "converge @S --points 8", "sweep @S --vary H/d=1:2:2", "bench @S"] {
        let line = format!("{} --set projectile.mass=5Pa", line.replace('S', "paper-slab"));
        let words = run(&line).refused();
        assert!(words.contains("`Pa` is a unit of pressure"), "{line}: {words}");
    }
    let mass = |line: &str| json(line)["scene"]["mass_kg"].as_f64();
    assert_eq!(mass("solve @tunnel --set projectile.mass=500g"), Some(0.5));
    // Half the mass, root of two times the speed.
    let critical = |set: &str| json(&format!("critical @paper-slab {set}"))["critical_velocity_m_s"].as_f64().unwrap();
    let ratio = critical("--set resistance.B=0 --set projectile.mass=1")
        / critical("--set resistance.B=0 --set projectile.mass=2");
    assert!((ratio - std::f64::consts::SQRT_2).abs() < 1e-12, "{ratio}");
    let rows = "dt_s,depth_m\n8,1.64\n4,1.16\n2,1.04\n1,1.01\n";
    let audit = |line: &str| run_with(rows, &format!("audit - {line}"));
    assert!(audit("--set projectile.mass=5kg").refused().contains("--scene"));
    assert!(run("bench --set projectile.mass=5kg").refused().contains("SCENES"));
}

/// Away from the repository: the answer to a name is that to its file, but for the time that it took.
#[test]
fn a_scene_that_ships_goes_by_its_name_wherever_a_scene_is_read_and_a_file_of_that_name_wins() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("r.csv"), "dt_s,depth_m\n8e-6,0.15\n4e-6,0.147\n2e-6,0.146\n").unwrap();
    let answer = |line: &str| {
        let mut answer = run_in(folder.path(), &format!("{line} --json")).json();
        answer["cost"]["wall_ns"].take();
        answer
    };
    for line in [
        "solve perforate",
        "critical perforate --set target.thickness=150mm",
        "converge perforate --points 5",
        "sweep perforate --vary H/d=1:2:2",
        "audit r.csv --scene perforate",
    ] {
        let of_file = answer(&line.replace("perforate", "@perforate"));
        assert!(of_file.is_object() && answer(line) == of_file, "{line}");
    }

    // A folder is no scene; a file is what is named.
    fs::create_dir(folder.path().join("tunnel")).unwrap();
    assert_eq!(answer("solve tunnel")["scene"]["title"], "rest in the tunnel");
    fs::copy(scene("crater"), folder.path().join("graze")).unwrap();
    assert_eq!(answer("solve graze")["scene"]["title"], "rest in the crater");
    for (name, help) in [
        ("tunel", "did you mean `tunnel`?"),
        ("stiff.toml", "did you mean `stiff`?"),
        ("my/slab.toml", "check the path; `penetrode scenes` lists the scenes that ship"),
    ] {
        let words = run_in(folder.path(), &format!("solve {name}")).refused();
        assert!(words.ends_with(&format!("Help: {help}")), "{words}");
    }
}

#[test]
fn the_scenes_that_ship_are_listed_and_one_is_printed_as_it_stands() {
    let mut shipped = names(Path::new(scene("tunnel").trim_end_matches("tunnel.toml")));
    // Beside them stand the tables that they name.
    shipped.retain(|name| Path::new(name).extension().is_some_and(|extension| extension == "toml"));
    let answer = json("scenes");
    conforms("scenes", &answer);
    let listed = answer["scenes"].as_array().unwrap();
    assert_eq!(listed.len(), shipped.len());
    let lines = run("scenes").out;
    for (one, line) in listed.iter().zip(lines.lines().skip(1)) {
        let [name, title] = ["name", "title"].map(|key| one[key].as_str().unwrap());
        assert!(line.split_whitespace().next() == Some(name) && line.ends_with(title), "{line}");
        let file = fs::read_to_string(scene(name)).unwrap();
        assert_eq!(run(&format!("scenes {name}")).out, file);
        assert_eq!(one["toml"], file);
    }
    assert!(run("scenes tunel").refused().ends_with("help: did you mean `tunnel`?"));
}

#[test]
fn the_laws_that_ship_are_listed_with_their_formulas() {
    let answer = json("scenes --laws");
    conforms("scenes", &answer);
    let laws = answer["scenes"].as_array().unwrap();
    let named = names(Path::new(scene("tunnel").trim_end_matches("tunnel.toml")));
    assert_eq!(
        laws.len(),
        named.iter().filter_map(|name| name.strip_suffix(".toml")).filter(|name| name.starts_with("law-")).count()
    );
    // A long formula goes on in the next line.
    let shown = run("scenes --laws").out.split_whitespace().collect::<String>();
    for law in laws {
        let (name, file) = (law["name"].as_str().unwrap(), law["toml"].as_str().unwrap());
        assert!(name.starts_with("law-") && shown.contains(&format!("{name}:")), "{name}");
        for force in law["forces"].as_array().unwrap() {
            let formula = force["force"].as_str().unwrap();
            let written = if formula.starts_with("a table of V: ") {
                "table = ".into()
            } else {
                format!("force = \"{formula}\"")
            };
            assert!(file.contains(&written), "{name}: {formula}");
            assert!(shown.contains(&format!("F={}", formula.replace(' ', ""))), "{name}: {formula}");
        }
    }
    assert!(run("scenes tunnel --laws").refused().contains("cannot be used with"));
}

#[test]
fn claims_are_listed_with_what_they_say_and_several_patterns_choose_among_them() {
    let ids = |line: &str| -> Vec<String> {
        let text = run(&format!("{line} --list")).expect(0).out;
        text.lines().filter(|line| !line.starts_with(' ')).map(str::to_owned).collect()
    };
    let all = ids("verify");
    assert!(all.len() > 900 && run("verify --list").out.contains("\n    The closed form agrees"), "{}", all.len());
    let count = |pattern: &dyn Fn(&str) -> bool| all.iter().filter(|id| pattern(id)).count();
    let [orders, eq15] = [count(&|id| id.contains("order/")), count(&|id| id.starts_with("eq15"))];
    assert!(orders > 0 && eq15 > 0);
    assert_eq!(ids("verify --only order/ --only 'eq15*'").len(), orders + eq15);
    assert!(ids("stress").iter().any(|id| id.starts_with("E1/")) && run("stress --list").out.contains("\n    "));
    let folder = tempfile::tempdir().unwrap();
    for (pattern, words) in
        [("none-such", "that contains `none-such` help: see"), ("'*none-such'", "that is `*none-such`")]
    {
        let said = run_in(folder.path(), &format!("verify --only eq15 --only {pattern}"));
        assert!(said.refused().contains(words), "{said:?}");
    }
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn quiet_leaves_the_answer_and_the_errors() {
    let [loud, quiet] = ["", "--quiet"].map(|option| run(&format!("solve tunnel {option}")).expect(0));
    assert!(loud.err.contains("warning: ") && quiet.err.is_empty(), "{quiet:?}");
    let answer = |said: &Said| said.out.lines().take(8).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(answer(&loud), answer(&quiet));
    assert_eq!(run("--quiet batch random:1 --out -").expect(0).err, "");
    assert!(run("--quiet solve nowhere").refused().contains("nowhere"));
}

/// Each request, and words of the refusal.
#[test]
fn a_request_that_cannot_be_served_is_refused_with_its_cause_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |line: &str, cause: &str| {
        let said = run_in(folder.path(), line);
        let words = said.refused();
        assert!(words.contains(cause) && !words.contains("unexpected argument"), "{line}: {words}");
    };
    for (arguments, cause) in [
        ("--method taylor --dt 1us", "--dt = 1us is not allowed"),
        ("--method taylor --velocity centred", "--velocity = centred is not allowed"),
        ("--method central-difference --rtol 1e-6", "--rtol = 1e-6 is not allowed"),
        ("--method closed-form --rtol 1e-6", "--rtol = 1e-6 is not allowed"),
        ("--method taylor --rtol nan", "--rtol"),
        ("--method taylor --rtol 1e-20", "--rtol = 1e-20 is not allowed"),
        ("--method central-difference --dt -1", "--dt"),
        ("--method central-difference --dt '1 kg'", "--dt"),
        ("--method runge-kutta", "runge-kutta"),
        ("--velocity centred", "--velocity = centred is not allowed"),
        ("--events step-end", "--events = step-end is not allowed"),
        ("--dt '1 us'", "--dt = 1 us is not allowed"),
        ("--method central-difference --dt '-1 us'", "--dt = -1 us is not allowed"),
        ("--method central-difference --dt 0", "--dt = 0 is not allowed"),
        ("--rtol -1e-3", "--rtol = -0.001 is not allowed"),
        ("--rtol 1e-300", "--rtol = 1e-300 is not allowed"),
    ] {
        refused(&format!("solve @tunnel {arguments} --json --trajectory t.csv"), cause);
    }
    for (arguments, cause) in [
        ("--vary H/d", "PATH=A:B:N"),
        ("--vary colour=1:2:3", "names no number"),
        ("--vary target.layer.0.strength=1:2:3", "fewer layers"),
        ("--vary H/d=1:2:3 --vary N=1:2:3 --vary I=1:2:3", "once or twice"),
        ("--vary H/d=1:2:3 --dt 1us", "--dt"),
        ("--vary N=1:2:3 --data @paper-slab", "H/d"),
        ("", "--vary"),
    ] {
        refused(&format!("sweep @paper-slab --out t.csv {arguments}"), cause);
    }
    for (line, cause) in [
        ("solve @viscous --method energy", "visc"),
        ("critical @tunnel", "semi-infinite target"),
        ("critical @paper-slab --spread H/d=0.1", "H/d"),
        ("critical @paper-slab --spread projectile.mass=-1", "-1"),
        ("critical @paper-slab --samples 10", "--spread"),
        ("sweep @paper-slab --vary H/d=1:2:3 --out no/such/folder/t.csv", "there is no folder"),
        ("stress --cases 0", "0"),
        ("batch random:0 --out -", "0"),
        ("batch random:1 --out r.csv --dt 1us", "--dt"),
        ("map --k -1", "-1"),
        ("map --k 0", "0"),
        ("map --k nan", "NaN"),
        ("experiments --k -1", "-1"),
        ("experiments no-such.csv", "no-such.csv"),
        ("bench no-such-scene.toml", "no-such-scene.toml"),
        ("bench @tunnel --parts everything", "everything"),
        ("bench @tunnel --repeats 0", "0"),
        ("bench @tunnel --peer ''", "is not a command"),
        ("", "Usage"),
    ] {
        refused(line, cause);
    }
    if !cfg!(feature = "parquet") {
        for line in ["sweep @paper-slab --vary H/d=1:2:3 --out t.parquet", "batch random:1 --out r.parquet"] {
            refused(line, "build with `--features parquet`");
        }
    }
    assert_eq!(names(folder.path()), [""; 0]);
    for order in ["-1", "0", "1e-3", "33", "1e300", "nan", "inf"] {
        let said = run_with("dt_s,depth_m\n8,1.64\n4,1.16\n2,1.04\n1,1.01\n", &format!("audit - --order {order}"));
        assert!(said.refused().contains("a number from 0.1 to 32") && said.err.len() < 300, "{said:?}");
    }
}

#[test]
fn a_flight_without_an_end_exits_1_with_the_state_reached_in_json() {
    let text = "[projectile]\nmass = 1\n[[stage]]\ndrag = 1\n[impact]\nvelocity = 10\n";
    let answer = run_with(text, "solve - --json").expect(1).json();
    assert_eq!(answer["schema"], "penetrode/solve/1");
    assert!(answer["error"]["message"].as_str().unwrap().contains("never ends"));
}

fn evaluations(line: &str) -> u64 {
    json(line)["cost"]["force_evaluations"].as_u64().unwrap()
}

#[test]
fn a_crater_flight_builds_no_tunnel() {
    let notes = json("solve @crater")["skipped"].to_string();
    assert!(notes.contains("stage 1"), "{notes}");
    assert!(evaluations("solve @crater") < evaluations("solve @tunnel"));
}

#[test]
fn a_trajectory_has_as_many_points_as_asked_for_or_times_of_ones_own() {
    let folder = tempfile::tempdir().unwrap();
    let solve = |options: &str| run_in(folder.path(), &format!("solve tunnel {options}"));
    let rows = |text: &str| -> Vec<Vec<f64>> {
        text.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect()
    };
    for method in MethodName::built() {
        let table = rows(&solve(&format!("--method {method} --points 5 --trajectory -")).expect(0).out);
        let answer = solve(&format!("--method {method} --points 5 --json")).expect(0).json();
        conforms("solve", &answer);
        let end = answer["time_s"].as_f64().unwrap();
        let path = answer["trajectory"].as_array().unwrap();
        assert_eq!((table.len(), path.len()), (5, 5), "{method}");
        for (i, (row, point)) in table.iter().zip(path).enumerate() {
            assert_eq!(row[0], end * (i as f64 / 4.0));
            for (column, name) in ["time_s", "depth_m", "velocity_m_s", "force_n", "stage"].iter().enumerate() {
                assert_eq!(row[column], point[name].as_f64().unwrap(), "{method}: {name}");
            }
        }
        assert_eq!((table[4][1], table[4][2]), (answer["depth_m"].as_f64().unwrap(), 0.0), "{method}");
    }
    assert!(solve("--json").json().get("trajectory").is_none());
    // 8.3e-4 s is behind the end; the other columns are somebody's own.
    let times = |text: &str| fs::write(folder.path().join("t.csv"), text).unwrap();
    times("# measured\nv,time_s\n300,0\n202,1e-4\n202,1e-4\n0,8.3e-4\n");
    let said = solve("--times t.csv");
    assert!(said.words().contains("warning: 1 time left out, behind the end of the flight at 829.197 µs"), "{said:?}");
    let lines: Vec<_> = said.out.lines().skip_while(|line| !line.starts_with("  time")).skip(1).take(3).collect();
    assert!(lines[0].starts_with("  0 s") && lines[1].starts_with("  100.000 µs") && lines[1] == lines[2], "{said:?}");
    for (text, words) in [
        ("time_s\n2e-4\n1e-4\n", "t.csv:3, column 1: `1e-4` in `time_s` is less than the time above it"),
        ("time_s\n-1e-4\n", "not a number >= 0"),
        ("1e-4\n2e-4\n", "time_s"),
    ] {
        times(text);
        let refused = solve("--times t.csv").refused();
        assert!(refused.contains(words), "{refused}");
    }
    for (options, words) in [
        ("--points 1", "2.."),
        ("--points 5 --times t.csv", "cannot be used with"),
        ("--times t.csv --trajectory t.csv", "the trajectory would replace the times"),
    ] {
        let refused = solve(options).refused();
        assert!(refused.contains(words), "{refused}");
    }
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
    let said = run_in(folder.path(), "verify suite.toml --out report --json").expect(0);
    assert_eq!(said.json()["counts"]["passed"], 1);
    conforms("verify", &said.json());
    assert!(folder.path().join("report/report.json").exists());
    // Far looser than what is measured: a warning, no more.
    assert!(said.err.contains("guards"));
    // And an impossible limit is a failed criterion, with the report written all the same.
    fs::write(&suite, text.replace("1e-3", "1e-30")).unwrap();
    let strict = run_in(folder.path(), "verify suite.toml --out report");
    assert!([0, 3].contains(&strict.code), "{strict:?}");
}

#[test]
fn bad_convergence_data_never_passes() {
    let exit = |rows: &[(f64, f64)]| {
        let rows = rows.iter().map(|(dt, x)| format!("{dt},{x}")).collect::<Vec<_>>().join("\n");
        run_with(&format!("dt_s,depth_m\n{rows}"), "audit -").code
    };
    let of = |f: &dyn Fn(f64) -> f64| exit(&[1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125].map(|h| (h, f(h))));
    assert_eq!(of(&|h| 1.0 + 0.1 * h * h), 0, "second order converges");
    assert_eq!(of(&|h| 1.0 + 0.01 / h), 3, "diverging");
    assert_eq!(of(&|_| 1.0), 4, "constant");
    assert_eq!(of(&|h| if h < 0.2 { f64::NAN } else { 1.0 + h }), 3, "not a number");
    assert_eq!(exit(&[(1.0, 1.0), (0.5, 1.1)]), 2, "two points");
    assert_eq!(exit(&[(1.0, 1.0), (1.0, 1.2), (0.5, 1.1), (0.25, 1.05), (0.125, 1.02)]), 2, "one step, two values");
}

#[test]
fn help_and_completion_are_there_for_every_command() {
    let commands = run("-h").expect(0).out;
    let commands: Vec<_> = commands.lines().skip_while(|line| *line != "Commands:").skip(1).collect();
    let names = commands.iter().map_while(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let names: Vec<_> = [""].into_iter().chain(names).collect();
    assert!(names.len() > 15 && names.contains(&"completions"), "{names:?}");
    for name in names {
        for (option, rows) in [("-h", 35), ("--help", 150)] {
            let text = run(&format!("{name} {option}")).expect(0).out;
            let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
            assert!(widest <= 80, "{name}: a line of {widest} characters");
            assert!(text.lines().count() <= rows, "{name} {option}: {} rows", text.lines().count());
            assert!(text.contains("\nExample") && text.contains("penetrode "), "{name} {option} has no example");
            assert!(!text.contains("[`"), "{name}: a link of the sources");
        }
    }
    // What `-h` leaves out is there, and `-h` says so.
    let [brief, whole] = ["-h", "--help"].map(|option| run(&format!("sweep {option}")).out);
    for words in ["Possible values", "moves the thickness"] {
        assert!(whole.contains(words) && !brief.contains(words), "{words}");
    }
    assert!(brief.contains("(see more with '--help')"), "{brief}");
    for shell in ["bash", "zsh", "fish"] {
        assert!(run(&format!("completions {shell}")).out.len() > 1000, "{shell}");
    }
}

/// Commands on the shipped scenes and data, each with what a person may add to see more.
fn commands_for_people() -> Vec<String> {
    let mut commands = [
        "map",
        "experiments",
        "experiments --spread target.strength=10%",
        "verify --only eq15",
        "scenes --laws",
        "bench @constant-force --repeats 1 --parts step-size",
    ]
    .map(str::to_owned)
    .to_vec();
    for name in names(&Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/scenes")) {
        let scene = name.trim_end_matches(".toml");
        for method in MethodName::built() {
            commands.push(format!("solve @{scene} --explain --method {method}"));
        }
        commands.extend([
            format!("solve @{scene} --explain --sensitivities"),
            format!("critical @{scene}"),
            format!("critical @{scene} --spread projectile.mass=5% --samples 20"),
            format!("converge @{scene} --points 12"),
            format!("converge @{scene} --points 8 --method energy"),
            format!("sweep @{scene} --vary projectile.mass=1:3:3"),
            format!("sweep @{scene} --vary H/d=0.5:18:5 --vary resistance.S=8:16:3:log"),
        ]);
    }
    commands
}

#[test]
fn no_line_for_people_is_longer_than_eighty_columns() {
    let folder = tempfile::tempdir().unwrap();
    for line in commands_for_people() {
        let said = run_in(folder.path(), &line);
        for text in [said.out, said.err] {
            // Where the file itself is quoted its path is whole, however long.
            let is_long = |line: &&str| line.chars().count() > 80 && !line.contains('/');
            assert_eq!(text.lines().find(is_long), None, "{line}");
        }
    }
}

#[test]
fn a_scene_without_a_critical_velocity_converges_without_it() {
    let answer = json("converge @stiff --method central-difference");
    assert!(answer["quantities"].as_array().unwrap().iter().all(|q| q["quantity"] != "critical_velocity"));
    assert!(answer["skipped"][0].as_str().unwrap().contains("perforated at any speed"), "{answer}");
    let answer = json("critical @stiff --spread projectile.mass=5%");
    assert_eq!((answer["critical_velocity_m_s"].as_f64(), &answer["uncertainty"]), (Some(0.0), &Value::Null));
    assert!(answer["skipped"][0].as_str().unwrap().contains("V_c is 0"), "{answer}");
}

/// What `command` says of a slab with `from` replaced by `to`: the scene is its standard input.
fn of_changed_slab(from: &str, to: &str, command: &str) -> Said {
    let text = fs::read_to_string(scene("perforate")).unwrap();
    assert!(text.contains(from), "{text}");
    run_with(&text.replace(from, to), command)
}

#[test]
fn a_flight_without_time_does_not_converge_and_names_no_step_for_it() {
    let words = of_changed_slab("\"400 m/s\"", "0.0", "converge -").refused();
    assert!(words.contains("the flight takes no time") && !words.contains("--dt"), "{words}");
}

#[test]
fn numbers_at_the_ends_of_the_range_are_short_and_never_nan() {
    let thin = |to: &str| of_changed_slab("\"180 mm\"", to, "critical -");
    let slow = |to: &str| of_changed_slab("\"400 m/s\"", to, "solve - --explain");
    let soft = |to: &str| ["solve - --explain", "critical -"].map(|line| of_changed_slab("S = 12.0", to, line));
    let mut all: Vec<Said> = ["0", "1e-300", "1e300"].map(thin).into();
    all.extend(["1e-200", "1e150", "1e300", "1e-300"].map(slow));
    all.extend(["S = 1e-300", "S = 1e300", "S = 1e-310"].map(soft).into_iter().flatten());
    for said in all {
        let text = said.out + &said.err;
        assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
        let is_number = |word: &str| word.contains(|c: char| c.is_ascii_digit());
        let is_short = |word: &str| !is_number(word) || word.len() < 40 || word.contains('/');
        assert!(text.split_whitespace().all(is_short), "{text}");
    }
    let slow = of_changed_slab("\"400 m/s\"", "1e-200", "solve -");
    assert!(!slow.out.contains("I 0 "), "an impact function above zero");
}

/// `critical` on a slab of `thickness` has no answer: exit code and cause, as text and in JSON.
#[track_caller]
fn has_no_critical_velocity(thickness: &str, options: &str, code: i32, cause: &str) -> Said {
    let said = of_changed_slab("\"180 mm\"", thickness, &format!("critical - {options}")).expect(code);
    assert!(said.out.is_empty() && said.words().contains(cause), "{said:?}");
    let answer = of_changed_slab("\"180 mm\"", thickness, &format!("critical - {options} --json")).json();
    assert!(answer["error"]["message"].as_str().unwrap().contains(cause));
    said
}

/// V_c² grows as e^(2 Q H/M): at 100 km of concrete it leaves the range of the numbers.
#[test]
fn the_search_for_a_critical_velocity_beyond_the_numbers_ends_with_its_cause() {
    has_no_critical_velocity("\"100 km\"", "", 1, "no critical velocity up to");
}

/// The closed form knows the margin to some ulp of V0², of which the drag leaves 1e-30.
#[test]
fn a_critical_velocity_inside_its_error_bar_is_undecided_and_not_a_number() {
    let said = has_no_critical_velocity("\"25 m\"", "--method closed-form", 4, "V_c is undecided");
    assert!(said.words().contains("--method taylor"), "{said:?}");
    for method in ["taylor", "energy"] {
        let line = format!("critical - --method {method} --json");
        let answer = of_changed_slab("\"180 mm\"", "\"25 m\"", &line).json();
        assert!(answer["relative_error"].as_f64().unwrap() < 1e-12, "{answer}");
    }
}

#[test]
fn init_writes_one_file_and_replaces_none() {
    let folder = tempfile::tempdir().unwrap();
    let init = |rest: &str| run_in(folder.path(), &format!("init {rest}"));
    fs::write(folder.path().join("scene.toml"), "mine").unwrap();
    fs::create_dir(folder.path().join("folder.py")).unwrap();
    for (rest, words) in [
        ("scene", "scene.toml is there already, and no file is replaced"),
        ("peer own.rs", "the ending of own.rs is that of no language known here help: the endings are .py, .cpp, "),
        ("peer own", "the ending of own is that"),
        ("peer own.py --language cpp", "own.py is no name of such a file help: let it end with .cpp or .cc or .cxx"),
        ("data results.txt", "let it end with .csv"),
        ("suite --language julia", "a suite has no language"),
        ("peer folder.py", "it is a folder"),
        ("peer no/such.py", "there is no folder no"),
        ("peer --language cobol", "possible values: python, cpp, fortran, julia, octave"),
    ] {
        let said = init(rest).refused();
        assert!(said.contains(words), "{rest}: {said}");
    }
    assert_eq!(fs::read_to_string(folder.path().join("scene.toml")).unwrap(), "mine");
    assert_eq!(names(folder.path()), ["folder.py", "scene.toml"]);
    let printed = init("peer - --language fortran").expect(0).out;
    init("peer peer.F90").expect(0);
    assert_eq!(fs::read_to_string(folder.path().join("peer.F90")).unwrap(), printed.replace("peer.f90", "peer.F90"));
    let said = init("peer 'my own.cpp'").expect(0).out;
    assert!(said.starts_with("my own.cpp is written. Next, with that name for peer.cpp:\n  g++ "), "{said}");
}
