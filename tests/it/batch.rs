//! `penetrode batch` from outside: every answer against 50 digits, the same bytes for any threads and neighbours,
//! refusals at their place, and nothing half written.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::fs;
use std::path::Path;

use penetrode::integrators::lanes::Summary;
use penetrode::physics::reference::Source;
use penetrode::physics::{Outcome, Parameter, Scene, State};
use penetrode::studies::critical_velocity;
use penetrode::studies::random_scenes::{Generator, errors_of};

use crate::program::{Said, run_in, run_with};

/// Numbers of a row.
const COLUMNS: &[Parameter] = Parameter::PLAIN.split_at(11).0;

/// The table of `rows`.
fn table(rows: &[String]) -> String {
    let header: Vec<_> = COLUMNS.iter().map(|parameter| parameter.column()).collect();
    format!("{}\n{}\n", header.join(","), rows.join("\n"))
}

/// A scene as a row.
fn row(scene: &Scene) -> String {
    let cell = |parameter: &Parameter| parameter.get(scene).map_or(String::new(), |value| value.to_string());
    COLUMNS.iter().map(cell).collect::<Vec<_>>().join(",")
}

fn random_scenes(count: usize) -> Vec<Scene> {
    let mut generator = Generator::new(1, "tests/batch");
    (0..count).map(|_| generator.next_scene()).collect()
}

/// `batch scenes.csv` with `options` in `folder`, the table being `scenes`.
fn run(folder: &Path, scenes: &str, options: &str) -> Said {
    fs::write(folder.join("scenes.csv"), scenes).unwrap();
    run_in(folder, &format!("batch scenes.csv {options}"))
}

/// Results of the table `scenes` with `options`.
fn results(scenes: &str, options: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), scenes, &format!("--out results.csv {options}")).expect(0);
    fs::read_to_string(folder.path().join("results.csv")).unwrap()
}

/// One line of results, read back.
fn flight(line: &str) -> (Summary, Option<f64>) {
    let cells: Vec<&str> = line.split(',').collect();
    let [_, outcome, depth, time, velocity, crater_time, crater_velocity, margin, critical, _, error] = cells[..]
    else {
        panic!("{line}")
    };
    assert_eq!(error, "", "{line}");
    let number = |cell: &str| (!cell.is_empty()).then(|| cell.parse::<f64>().unwrap());
    let outcomes = [Outcome::StoppedInCrater, Outcome::StoppedInTunnel, Outcome::Perforated, Outcome::Undecided];
    let end = State { time: number(time).unwrap(), depth: number(depth).unwrap(), velocity: number(velocity).unwrap() };
    let summary = Summary {
        outcome: outcomes.into_iter().find(|o| o.name() == outcome).unwrap(),
        stage: 0,
        end,
        crater_end: number(crater_time).map(|time| State {
            time,
            depth: 0.0,
            velocity: number(crater_velocity).unwrap(),
        }),
        exit_margin: number(margin),
        exit_margin_error: None,
        cost: penetrode::integrators::Cost::default(),
    };
    (summary, number(critical))
}

#[test]
fn a_thousand_random_scenes_agree_with_50_digits_in_every_outcome_and_number() {
    let scenes = random_scenes(1000);
    let rows: Vec<String> = scenes.iter().map(row).collect();
    let text = results(&table(&rows), "");
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(lines.len(), scenes.len());
    let (mut worst, mut undecided) = (0.0_f64, 0);
    for (index, (scene, line)) in scenes.iter().zip(lines).enumerate() {
        assert!(line.starts_with(&format!("{},", index + 1)), "{line}");
        let (found, _) = flight(line);
        assert_eq!(found.exit_margin.is_some(), scene.thickness.is_some(), "{line}");
        undecided += usize::from(found.outcome == Outcome::Undecided);
        let errors = errors_of(Source::Scene(scene, scene.velocity.unwrap()), &found.flight())
            .unwrap_or_else(|e| panic!("{line}: {e}"));
        // In units of rounding, over max(1, condition number); the goal is 5e-15 in depth, 22 of them.
        worst = errors.0.iter().fold(worst, |worst, (error, _)| if *error <= worst { worst } else { *error });
    }
    assert!(worst <= 8.0, "{worst} rounding units");
    assert!(undecided <= 1, "{undecided} undecided");
}

#[test]
fn threads_change_no_bit() {
    let rows: Vec<String> = random_scenes(3000).iter().map(row).collect();
    let one = results(&table(&rows), "--threads 1");
    assert_eq!(one, results(&table(&rows), "--threads 2"));
    assert_eq!(one, results(&table(&rows), "--threads 7"));
}

#[test]
fn critical_velocities_are_those_of_the_closed_form() {
    let scenes = random_scenes(60);
    let rows: Vec<String> = scenes.iter().map(row).collect();
    for method in ["taylor", "energy"] {
        let text = results(&table(&rows), &format!("--critical --method {method}"));
        for (line, scene) in text.lines().skip(1).zip(&scenes) {
            let (_, critical) = flight(line);
            assert_eq!(critical.is_some(), scene.thickness.is_some(), "{line}");
            if let Some(critical) = critical {
                let exact = critical_velocity::exact(scene).unwrap();
                assert!((critical / exact - 1.0).abs() < 1e-12, "{method}: {critical} {exact}");
            }
        }
    }
}

#[test]
fn a_flight_stays_where_its_critical_velocity_fails_or_is_undecided() {
    // Drag over 2 km takes all that a number can hold; over 40 m, what the closed form's margin can resolve.
    let of_thickness = |thickness: &str| format!("2,0.05,0.72,36e6,2300,{thickness},,,,,300");
    let folder = tempfile::tempdir().unwrap();
    for (thickness, bad, undecided, cause) in [("2000", 1, 0, "no critical velocity"), ("40", 0, 1, "V_c is undecided")]
    {
        let scenes = table(&["", thickness].map(of_thickness));
        let said = run(folder.path(), &scenes, "--out r.csv --critical --method closed-form");
        let expected = (if bad > 0 { 3 } else { 0 }, format!("2 rows: {bad} bad, {undecided} undecided\n"));
        assert_eq!((said.code, said.err), expected);
        let text = fs::read_to_string(folder.path().join("r.csv")).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.splitn(11, ',').collect()).collect();
        // The flight of the thick slab ends in it as in the semi-infinite target.
        assert_eq!(rows[1][1..7], rows[0][1..7]);
        assert_eq!((rows[0][8], rows[0][10], rows[1][8]), ("", "", ""));
        assert!(rows[1][10].starts_with(&format!("\"line 3: {cause}")), "{}", rows[1][10]);
    }
}

#[test]
fn a_table_may_come_from_a_pipe_and_go_into_one_and_without_rows_has_results_without_rows() {
    let said = run_with(&table(&["2,0.05,0.72,36e6,2300,,,,,,300".to_owned()]), "batch - --out -").expect(0);
    assert!(said.out.contains("\n1,stopped-in-tunnel,0.1448"));
    let said = run_with(&table(&[]), "batch - --out -").expect(0);
    assert!(said.out.lines().count() == 1 && said.err.contains("0 rows"), "{said:?}");
}

#[test]
fn random_tables_are_fixed_by_their_seed() {
    let folder = tempfile::tempdir().unwrap();
    let make = |scenes: &str| run_in(folder.path(), &format!("batch {scenes} --out -")).expect(0).out;
    let (long, short) = (make("random:2000:7"), make("random:1500:7"));
    assert_eq!(short.lines().count(), 1501);
    assert!(long.starts_with(&short));
    assert_ne!(short, make("random:1500:8"));
}

#[test]
fn parts_of_a_table_one_behind_the_other_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let rows: Vec<String> =
        (1..=10).map(|i| format!("2,0.05,0.72,36e6,2300,,,,,,{}", 50 * i)).chain(["bad".to_owned()]).collect();
    fs::write(folder.path().join("scenes.csv"), table(&rows)).unwrap();
    // The numbers of rows, the lines in messages and every digit are those of the whole.
    for (scenes, codes) in [("scenes.csv", [3, 0]), ("random:3000:5", [0, 0])] {
        let run = |options: &str| run_in(folder.path(), &format!("batch {scenes} --out - {options}"));
        let whole = run("").expect(codes[0]).out;
        let header = whole.lines().next().unwrap();
        let mut together = format!("{header}\n");
        for part in 1..=4 {
            let said = run(&format!("--part {part}/4")).expect(if part == 4 { codes[0] } else { codes[1] });
            together += said.out.strip_prefix(&format!("{header}\n")).unwrap();
        }
        assert_eq!(together, whole);
    }
    let said = run_in(folder.path(), "batch scenes.csv --out - --part 1/100").expect(0);
    assert!(said.err.contains("part 1 of 100 is empty"), "{}", said.err);
    for (part, why) in [("0/4", "7/1000"), ("5/4", "7/1000"), ("x", "7/1000")] {
        assert!(run_in(folder.path(), &format!("batch scenes.csv --out - --part {part}")).refused().contains(why));
    }
    let said = run_with(&table(&[]), "batch - --out - --part 1/2").refused();
    assert!(said.contains("standard input cannot be cut"), "{said}");
}

#[test]
fn columns_may_be_in_other_units() {
    let si = "mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,velocity_m_s\n2,0.05,0.72,36e6,2300,300\n";
    let other = "mass_g,diameter_mm,nose_factor,strength_mpa,density_g_cm3,velocity_km_s\n2000,50,0.72,36,2.3,0.3\n";
    let [si, other] = [si, other].map(|table| run_with(table, "batch - --out -").expect(0).out);
    assert_eq!(si, other);
}

/// Against the same table without them, line by line.
#[test]
fn columns_that_are_not_read_go_with_their_rows() {
    let rows = [("2,0.05,0.72,36e6,2300,300", "A-1,\"a, \"\"b\"\"\",-3.50"), ("2,0.05,0.72,-1,2300,300", "A-2,,=1")];
    let header = "mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,velocity_m_s";
    let lines = |with: bool| {
        let line = |(scene, kept): &(&str, &str)| if with { format!("{kept},{scene}\n") } else { format!("{scene}\n") };
        let names = if with { "shot id,note,\"dx, dy\"," } else { "" };
        format!("{names}{header}\n{}", rows.iter().map(line).collect::<String>())
    };
    let folder = tempfile::tempdir().unwrap();
    let said = run(folder.path(), &lines(true), "--out results.csv --threads 1").expect(3);
    assert!(said.words().contains("passed on unread: shot id, note, dx, dy"), "{}", said.words());
    let found = fs::read_to_string(folder.path().join("results.csv")).unwrap();
    run(folder.path(), &lines(false), "--out results.csv").expect(3);
    let plain = fs::read_to_string(folder.path().join("results.csv")).unwrap();
    let kept = ["shot id,note,\"dx, dy\"", "A-1,\"a, \"\"b\"\"\",\"-3.50\"", "A-2,,\"'=1\""];
    for ((found, plain), kept) in found.lines().zip(plain.lines()).zip(kept) {
        // The message says in which column of the table the cell stands.
        assert_eq!(found.replace("column 7", "column 4"), format!("{plain},{kept}"));
    }
    // A cell that is no text is not lost in silence.
    fs::write(
        folder.path().join("bytes.csv"),
        [header.as_bytes(), b",lab\n", rows[0].0.as_bytes(), b",\xff\n"].concat(),
    )
    .unwrap();
    run_in(folder.path(), "batch bytes.csv --out bytes-out.csv").expect(3);
    assert!(fs::read_to_string(folder.path().join("bytes-out.csv")).unwrap().contains("column 7: not text"));
}

#[test]
fn columns_that_may_be_meant_for_others_are_refused() {
    let table = |name: &str| {
        format!(
            "mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,velocity_m_s,{name}\n2,0.05,0.72,36e6,2300,300,1\n"
        )
    };
    let folder = tempfile::tempdir().unwrap();
    for (name, meant) in [
        ("thicknes_m", "`thickness_m` meant"),
        ("Thickness_mm", "`thickness_m` meant"),
        ("thickness_stone", "`thickness_m` meant"),
        ("tihckness (mm)", "`thickness_m` meant"),
        ("critereon", "`criterion` meant"),
        ("crater_stifness_kN_mm", "`crater_stiffness_n_m` meant"),
        ("b", "`B` meant"),
        ("K", "`k` meant"),
        ("s", "`S` meant"),
        ("crh", "`CRH` meant"),
        ("tip ratio", "`tip_ratio` meant"),
        ("h_mm", "`thickness_m` meant"),
        ("", "there is no column ``"),
        ("depth_m", "and so have the results"),
        ("error", "and so have the results"),
        ("impact.velocity", "`velocity_m_s` meant"),
        ("target.density", "the path of a number"),
        ("mass_g", "twice"),
    ] {
        let said = run(folder.path(), &table(name), "--out results.csv").refused();
        assert!(said.contains(meant), "{name}: {said}");
    }
    for name in ["note", "shot", "id", "No.", "measured_depth_mm", "lab (city)", "date", "source", "case"] {
        run(folder.path(), &table(name), "--out results.csv").expect(0);
    }
    let varied = |name: &str| format!("impact.velocity,{name}\n300,1\n");
    for name in ["velocity_m_s", "impact.velocty", "target.thicknes", "parameters.P", "mass_kg", "row"] {
        run(folder.path(), &varied(name), "--scene tunnel --out results.csv").refused();
    }
    let said = run(folder.path(), &varied("shot"), "--scene tunnel --out results.csv").expect(0);
    assert!(said.words().contains("passed on unread: shot"), "{}", said.words());
}
