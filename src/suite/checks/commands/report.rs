//! The report of `verify` on a small suite: each form of it says the same of each claim.

use super::answer::{Answer, run};
use crate::suite::checks::Subject;
use crate::suite::claim::{Found, Measurement};

check! {
    /// `verify` on a suite in which claims pass, fail, are skipped and undecided: verdict, measured value and limit of each
    /// claim in `report.json`, `report.html`, `junit.xml` and `summary.md`, the counts, and the exit code.
    Report {} in Commands, "contradictions", by report, compares nothing;
}

/// A claim of the small suite: its table, its verdict, and the value that it must measure, where that is known.
type Known = (&'static str, &'static str, &'static str, Option<f64>);

const STATED: &str = "check = { stated = { value = 365.0 } }\nscenes = [\"perforate\"]\nmethods = [\"taylor\"]\n\
                      quantities = [\"critical_velocity\"]";
const SKIPPED: &str = "check = { agreement = {} }\nscenes = [\"viscous\"]\nmethods = [\"energy\"]\n\
                       quantities = [\"depth\"]";
const UNDECIDED: &str = "check = { order = { order = 2.0, points = 3 } }\nscenes = [\"tunnel\"]\n\
                         methods = [\"central-difference\"]\nvelocities = [\"centred\"]\nboundaries = [\"landed\"]\n\
                         quantities = [\"depth\"]";

/// |364.024.../365 - 1|, by hand.
const MEASURED: f64 = 2.673_869_158_797e-3;

const CLAIMS: [Known; 4] = [
    ("a/passed", STATED, "passed", Some(MEASURED)),
    ("a/failed", STATED, "failed", Some(MEASURED)),
    ("b/skipped", SKIPPED, "skipped", None),
    ("b/undecided", UNDECIDED, "undecided", None),
];

fn limit_of(id: &str) -> f64 {
    if id == "a/failed" { 0.00125 } else { 0.0375 }
}

fn suite(claims: &[Known]) -> String {
    let claim = |(id, check, ..): &Known| {
        let limit = limit_of(id);
        format!("[[claim]]\nid = \"{id}\"\nstatement = \"S {id}\"\n{check}\nlimit = {limit}\nreason = \"R {id}\"\n")
    };
    format!("title = \"small\"\n{}", claims.iter().map(claim).collect::<String>())
}

fn report(subject: &Subject<'_>) -> Found {
    let program = subject.program()?;
    let mut seen = Vec::new();
    let mut see = |holds: bool, what: String| {
        if !holds {
            seen.push(what);
        }
    };
    // A suite that shows nothing is undecided.
    for (claims, verdict, code) in [
        (&CLAIMS[..1], "passed", 0),
        (&CLAIMS[2..], "undecided", 4),
        (&CLAIMS[..], "failed", 3),
        (&CLAIMS[2..3], "undecided", 4),
    ] {
        let text = suite(claims);
        let given = [("s.toml", text.as_str())];
        let line = "verify s.toml --out report";
        let (said, files) = run(program, line, &given)?;
        let (json, _) = run(program, &format!("{line} --json"), &given)?;
        let file = |name: &str| files.iter().find(|(path, _)| path == name).map_or("", |(_, text)| text.as_str());
        let [page, xml, markdown] = ["report/report.html", "report/junit.xml", "report/summary.md"].map(file);
        let kept = serde_json::from_str(file("report/report.json"))?;
        let answer = Answer::read(line, &json)?;
        see(said.code == code && json.code == code, format!("exits {} in place of {code}", said.code));
        for json in [&answer.json, &kept] {
            see(json["verdict"] == verdict, format!("the verdict is {} and not {verdict}", json["verdict"]));
        }
        let count = |of: &str| claims.iter().filter(|(_, _, verdict, _)| *verdict == of).count();
        let [passed, failed, undecided, skipped] = ["passed", "failed", "undecided", "skipped"].map(count);
        for (of, count) in [("passed", passed), ("failed", failed), ("undecided", undecided), ("skipped", skipped)] {
            for json in [&answer.json, &kept] {
                see(json["counts"][of] == count, format!("{} {of} and not {count}", json["counts"][of]));
            }
        }
        let counts = format!("{verdict}: {passed} passed, {failed} failed, {undecided} undecided, {skipped} skipped");
        see(said.out.lines().any(|line| line == counts), format!("no line `{counts}`"));
        let totals =
            format!("tests=\"{}\" skipped=\"{skipped}\" failures=\"{failed}\" errors=\"{undecided}\"", claims.len());
        see(xml.contains(&format!("<testsuites name=\"small\" {totals}")), format!("no {totals} in junit.xml"));
        let hash = blake3::hash(text.as_bytes()).to_hex().to_string();
        see(kept["environment"]["suite_hash"] == hash, format!("the hash is {}", kept["environment"]["suite_hash"]));
        // In seconds, rounded to milliseconds.
        let seconds =
            claims.iter().enumerate().filter_map(|(i, _)| kept["claims"][i]["wall_ms"].as_f64()).sum::<f64>() / 1e3;
        let said = xml.split(" time=\"").nth(1).and_then(|rest| rest.split('"').next()?.parse::<f64>().ok());
        see(
            said.is_some_and(|said| (said - seconds).abs() <= 2e-3),
            format!("junit.xml says {said:?} for {seconds} s"),
        );
        see(markdown.contains(&format!("small: {verdict}")), format!("summary.md does not say {verdict}"));
        for (i, (id, _, verdict, value)) in claims.iter().enumerate() {
            let (limit, claim) = (limit_of(id), &answer.json["claims"][i]);
            for claim in [claim, &kept["claims"][i]] {
                let fields = [
                    ("id", *id),
                    ("verdict", *verdict),
                    ("statement", &format!("S {id}")),
                    ("reason", &format!("R {id}")),
                ];
                for (field, is) in fields {
                    see(claim[field] == is, format!("{field} of {id}: {}", claim[field]));
                }
                see(claim["limit"].as_f64() == Some(limit), format!("limit of {id}: {}", claim["limit"]));
                let measured = claim["measured"].as_f64();
                let is_known =
                    value.is_none_or(|value| measured.is_some_and(|measured| (measured / value - 1.0).abs() < 1e-9));
                see(is_known && (*verdict != "skipped" || measured.is_none()), format!("{id} measures {measured:?}"));
            }
            // Three digits on the page and in Markdown, all of them in XML; what is skipped or undecided has none.
            let shown = value.map_or("—".to_owned(), |value| format!("{value:.5}"));
            let cells = format!("{verdict} | {shown} | {limit} ");
            let has_row = page.split("<tr").skip(1).map(words).any(|row| row.contains(id) && row.contains(&cells));
            see(has_row, format!("the page has no row of {id} with `{cells}`"));
            let case =
                xml.split("<testcase ").find(|case| case.starts_with(&format!("name=\"{id}\""))).unwrap_or_default();
            let status = match *verdict {
                "failed" => "<failure ",
                "undecided" => "<error ",
                "skipped" => "<skipped ",
                _ => "<system-out>",
            };
            let stands =
                ["<failure ", "<error ", "<skipped "].iter().all(|other| case.contains(other) == (*other == status));
            see(stands && case.contains(status), format!("junit.xml does not call {id} {verdict}: {case}"));
            if let Some(value) = claim["measured"].as_f64().filter(|_| value.is_some()) {
                let numbers = format!("measured {value:e}, limit {limit:e} ");
                see(case.contains(&numbers), format!("junit.xml has no `{numbers}` for {id}: {case}"));
            }
            let is_listed = markdown.contains(&format!("| {shown} | {limit} "));
            see(is_listed, format!("summary.md has no `{shown} | {limit}` for {id}"));
        }
    }
    let count = seen.len();
    Ok(Measurement::count(count).remark(seen.into_iter().next().unwrap_or_default()))
}

/// The text of the row of a table, its cells parted by `|`.
fn words(row: &str) -> String {
    let row = row.split("</tr>").next().unwrap_or_default();
    let mut text = String::new();
    for piece in row.split('<') {
        let (tag, rest) = piece.split_once('>').unwrap_or(("", ""));
        text.push_str(if tag.starts_with("td") || tag.starts_with("th") { " | " } else { " " });
        text.push_str(rest);
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
