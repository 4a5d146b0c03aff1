//! The reports of `converge`, `audit` and `diagnose`: each file says of the user's code what the command says.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use penetrode::report::references::REFERENCES;
use serde_json::Value;

use crate::program::{Said, conforms, names, run_in};

/// The lagged scheme through the scene `perforate`, landing on boundaries.
const GOOD: &str = "dt_s,depth_m,time_s,velocity_m_s,peak_force_kn\n\
                    4e-6,0.18,6.284666391876777e-4,134.60298957430106,810.32\n\
                    2e-6,0.18,6.2828134204179e-4,134.80502593865666,810.08\n\
                    1e-6,0.18,6.281868603759894e-4,134.90686342544095,810.02\n\
                    5e-7,0.18,6.281391621356539e-4,134.95798652400637,810.005\n";

/// Its velocity is that of a flight that leaves, where the scene comes to rest; the depth scatters.
const BAD: &str =
    "dt_s,depth_m,velocity_m_s\n4e-6,0.1461,136\n2e-6,0.1452,135.5\n1e-6,0.1461,135.25\n5e-7,0.1449,135.125\n";

/// A solver that has no answer, and a name that means something to each format.
#[cfg(unix)]
const SOLVER: &str = "read hello; printf '%s\\n' '{\"name\":\"=1 <script>a()</script> \\u001b[2J\\u202e @me ]]> #7\",\"version\":\"1_0\",\"method\":\"none & all\"}'; \
                      while read -r line; do id=${line#*\\\"id\\\":}; id=${id%%[,\\}]*}; \
                      echo \"{\\\"id\\\":$id,\\\"error\\\":\\\"no idea\\\"}\"; done";

/// A report as it was written, and what the command said.
struct Report {
    said: Said,
    json: Value,
    folder: tempfile::TempDir,
}

impl Report {
    /// The report of `line`, run in a folder with `given`; the command says the same as JSON.
    fn of(given: &[(&str, &str)], line: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in given {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let said = run_in(folder.path(), &format!("{line} --out report"));
        let json = run_in(folder.path(), &format!("{line} --json")).json();
        Self { said, json, folder }
    }

    fn file(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join("report").join(name))
            .unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The page as a person reads it: tags away, entities and no-break spaces as they look.
    fn page(&self) -> String {
        let page = self.file("report.html");
        let body = page.split_once("</head>").unwrap().1;
        let text: String = body.split('<').map(|piece| piece.split_once('>').map_or(piece, |(_, text)| text)).collect();
        text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&").replace('\u{a0}', " ")
    }

    /// What every report holds.
    fn check(&self, command: &str, code: i32) {
        assert_eq!(self.said.code, code, "{:?}", self.said);
        assert!(self.said.out.ends_with(&format!("report: {}\n", Path::new("report/report.html").display())));
        assert_eq!(serde_json::from_str::<Value>(&self.file("report.json")).unwrap(), self.json);
        conforms(command, &self.json);
        let verdict = self.json["verdict"].as_str().unwrap();
        let (page, markdown) = (self.file("report.html"), self.file("summary.md"));
        assert!(
            page.contains("</span><span class=\"sum\">")
                && page.contains(&format!("<div class=\"verdict {verdict}\">"))
        );
        assert!(markdown.lines().next().unwrap().ends_with(&format!(": {verdict}")), "{markdown:.80}");
        // The verdict and its numbers come before any section but their own.
        let first = page.find("class=\"verdict").unwrap();
        assert!(first < page.find("class=\"counts headline").unwrap() && first < page.find("<h2 id=\"judged").unwrap());
        let bib = self.file("references.bib");
        let listed = |key: &str| bib.contains(&format!("{{{key},"));
        for reference in &REFERENCES {
            let key = reference.key;
            let is_cited = page.contains(&format!("href=\"#ref-{key}\""));
            assert_eq!(is_cited, page.contains(&format!("id=\"ref-{key}\"")), "{key} on the page");
            assert_eq!(is_cited, listed(key), "{key} in references.bib");
        }
        let tex = self.file("table.tex") + &self.file("uncertainty.tex");
        for keys in tex.split("\\cite{").skip(1) {
            keys.split('}').next().unwrap().split(',').for_each(|key| assert!(listed(key), "{key}"));
        }
        // Sections, tables and figures are numbered in order.
        for (head, what) in
            [("<b>Table ", "table"), ("<b>Figure ", "figure"), ("title=\"to the contents\">", "section")]
        {
            let numbers =
                page.split(head).skip(1).map(|rest| rest.chars().take_while(char::is_ascii_digit).collect::<String>());
            let numbers: Vec<usize> = numbers.map(|number| number.parse().unwrap()).collect();
            assert!(numbers.iter().copied().eq(1..=numbers.len()) && !numbers.is_empty(), "{what}: {numbers:?}");
        }
        let list: BTreeSet<String> = self.file("contents.txt").lines().map(str::to_owned).collect();
        for linked in page.split("href=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
            assert!(
                linked.starts_with(['#', 'd']) || linked.starts_with("https://doi.org/") || list.contains(linked),
                "{linked}"
            );
        }
        assert_eq!(list.len(), self.file("contents.txt").lines().count(), "a name stands twice");
        let xml = quick_junit::Report::deserialize_from_str(&self.file("junit.xml")).unwrap();
        assert_eq!(xml.failures + xml.errors > 0, verdict != "passed", "{verdict}");
    }
}

/// A number with two digits as the page has it.
fn two_digits(value: f64) -> String {
    penetrode::report::text::number(value, 2).replace('\u{a0}', " ")
}

#[test]
fn the_report_of_a_scheme_shows_its_orders_its_table_and_its_uncertainty() {
    let report = Report::of(&[], "converge @tunnel --points 20");
    report.check("converge", 0);
    let page = report.page();
    let quantities = report.json["quantities"].as_array().unwrap();
    let errors = quantities.iter().map(|quantity| quantity["points"][0]["error"].as_f64().unwrap());
    let largest = two_digits(errors.fold(0.0, f64::max));
    assert!(page.contains(&format!("Largest error on the finest step{largest}of ")), "{largest}: {page:.900}");
    // The drag acts behind x = k d: what is taken there has not met it.
    let coverage = report.file("tables/coverage.csv");
    let row = |name: &str| {
        coverage.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {coverage}"))
    };
    assert_eq!(row("stiffness,"), "stiffness,1,1,1,1,1,1,1,1");
    assert_eq!(row("drag,"), "drag,1,1,1,1,0,0,0,0");
    assert!(
        page.contains(
            "The path does not meet, and nothing is shown of: driving force, later stiffness, softening, viscosity,"
        ),
        "{page:.900}"
    );
    let table = report.file("tables/grid-convergence.csv");
    let tex = report.file("uncertainty.tex");
    for (index, quantity) in quantities.iter().enumerate() {
        let three = &quantity["three_grids"];
        let name = quantity["quantity"].as_str().unwrap().replace('_', " ");
        for (row, value) in
            [(0, &three["steps"][0]), (5, &three["values"][0]), (8, &three["order"]), (9, &three["extrapolated"])]
        {
            let line = table.lines().nth(row + 1).unwrap();
            let cell: f64 = line.split(',').nth(index + 1).unwrap().parse().unwrap();
            assert_eq!(Some(cell), value.as_f64(), "{name}: {line}");
        }
        // The bar covers every error that the order rests on: the law times the worst over it.
        let (band, exact) =
            (quantity["error_band"]["half_width"].as_f64().unwrap(), quantity["exact"].as_f64().unwrap());
        let finest = quantity["points"].as_array().unwrap().iter().find(|point| point["used"] == true).unwrap();
        assert!((finest["value"].as_f64().unwrap() - exact).abs() <= band * (1.0 + 1e-9), "{name}");
        let said = format!("unum({name}) = {} ", two_digits(band));
        assert!(page.contains(&said), "{said}");
        assert!(tex.contains(&format!("$u_{{\\mathrm{{num}}}}$({name}) = ")), "{tex}");
    }
}

#[test]
fn the_report_of_an_adaptive_method_has_tolerances_for_steps() {
    let report = Report::of(&[], "converge @tunnel --method taylor --points 8");
    let verdict = report.json["verdict"].as_str().unwrap();
    report.check("converge", if verdict == "passed" { 0 } else { 4 });
    assert!(report.page().contains("at 8 tolerances against the closed form"));
    assert!(!report.file("table.tex").contains("grid convergence"));
}

#[test]
fn the_report_of_a_table_names_it_and_what_is_wrong_with_it() {
    let good = Report::of(&[("good.csv", GOOD)], "audit good.csv --scene @perforate");
    good.check("audit", 0);
    let page = good.page();
    assert!(good.file("report.html").contains("<title>good.csv: passed</title><style>"));
    let sum = "All 4 quantities pass: 2 of the order expected, 1 converging, 1 with the exact value as limit for small steps, 1 fixed by the \
               scene and met.";
    assert!(page.contains(sum), "{page:.900}");
    let bad = Report::of(&[("bad_&_<b>.csv", BAD)], "audit 'bad_&_<b>.csv' --scene @tunnel");
    bad.check("audit", 3);
    let page = bad.page();
    assert!(page.contains("1 of 2 quantities fail"), "{page:.900}");
    // The values approach 135 m/s where the projectile rests: the error is 135.125/300, and not that against their limit.
    assert!(
        page.contains(
            "Largest error on the finest step0.45of velocity, relative to the impact velocity, at Δt = 500 ns"
        ),
        "{page:.900}"
    );
    assert!(bad.file("tables/coverage.csv").contains("\nrest,0,1,0,1\n"), "{}", bad.file("tables/coverage.csv"));
    // The reason stands once, beside the verdict.
    let why = "the values approach 135.";
    assert!(page.matches(why).count() == 1 && bad.file("summary.md").matches(why).count() == 1, "{page:.900}");
    let unstated = "No uncertainty is stated for depth (undecided), velocity (failed); section 1 says why.";
    assert!(page.contains(unstated) && !bad.file("uncertainty.tex").contains("velocity"));
    assert!(bad.file("junit.xml").contains("<failure message=\"velocity 1.35125e2 m/s, error band "));
}

#[cfg(unix)]
#[test]
fn the_report_of_a_solver_counts_its_answers() {
    let report = Report::of(&[("solver.sh", SOLVER)], "diagnose 'sh solver.sh' --questions 24");
    report.check("diagnose", 3);
    let page = report.page();
    let asked = report.json["counts"]["asked"].as_u64().unwrap();
    assert!(page.contains(&format!("Wrong: {asked} of {asked} answers fail.")), "{page:.900}");
    // The greeting keeps no control characters.
    let name = "=1 <script>a()</script> \\u{1b}[2J\u{fffd} @me ]]> #7";
    assert!(
        page.contains(&format!("{name} 1_0")) && page.contains(&format!("Answers right0 of {asked}")),
        "{page:.900}"
    );
    // Nothing in a name acts: no script, no control of a terminal or of the direction of writing, no mention, no formula.
    for name in report.file("contents.txt").lines() {
        let text = report.file(name);
        let is_data = name == "report.json";
        assert!(is_data || !text.contains("<script") && !text.contains(['\u{1b}', '\u{202e}']), "{name}");
        assert!(!name.starts_with("tables/") || !text.lines().any(|line| line.starts_with('=')), "{name}");
    }
    assert!(!report.file("summary.md").contains("@me") && !report.file("junit.xml").contains("]]> #"));
    assert_eq!(report.file("uncertainty.tex"), "");
    let cases = report.file("junit.xml").matches("<testcase ").count();
    assert_eq!(cases, report.json["questions"].as_array().unwrap().len());
}

#[test]
fn a_report_replaces_one_of_its_command_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("good.csv"), GOOD).unwrap();
    let run = |line: &str| run_in(folder.path(), line);
    for _ in 0..2 {
        run("audit good.csv --scene @perforate --out report").expect(0);
    }
    let before = names(&folder.path().join("report"));
    let other = run("converge @tunnel --points 4 --out report").refused();
    assert!(other.contains("report holds a report of `audit`, which one of `converge` does not replace"), "{other}");
    let solver = run("diagnose sh --out report").refused();
    assert!(solver.contains("which one of `diagnose` does not replace"), "{solver}");
    assert_eq!(names(&folder.path().join("report")), before);
    // The table lies in the folder, and is listed there by a hand that is not ours.
    let table = folder.path().join("report/tables/results.csv");
    fs::write(&table, GOOD).unwrap();
    let inside = run("audit report/tables/results.csv --out report").refused();
    assert!(inside.contains("would replace report/tables/results.csv, which lies in report"), "{inside}");
    assert_eq!(fs::read_to_string(table).unwrap(), GOOD);
    let file = run("audit good.csv --out good.csv").refused();
    assert!(file.contains("good.csv is a file, and a report is a folder"), "{file}");
}
