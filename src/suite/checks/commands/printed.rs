//! Each number that `solve` and `critical` print against the one computed elsewhere from the text of the scene.

use rayon::prelude::*;
use serde_json::Value;

use super::answer::{Answer, apart, run, with_unit};
use crate::exchange::scene_file::SHIPPED;
use crate::suite::checks::{Subject, Worst};
use crate::suite::claim::{Found, NotMeasured};
use crate::suite::recorded::{self, RecordedScene};

check! {
    /// Each number of `solve --json` and `critical --json` by the claim's method, on every scene of
    /// `verification/references/exact.json`, against the one there: numbers, words, and what is `null`.
    Printed {
        /// Only each so-manieth scene.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        each: usize,
    } in Commands, "relative x condition", by printed, compares (Commands | Elsewhere);

    /// Each number in the text of `solve` and `critical` on the shipped scenes, found by its label, against that of the JSON.
    PrintedText {} in Commands, "half units of the last digit", by printed_text, compares nothing;
}

fn printed(Printed { each }: &Printed, subject: &Subject<'_>) -> Found {
    let (program, method) = (subject.program()?, subject.method_name());
    let scenes = recorded::scenes().map_err(NotMeasured::broken)?;
    let of_scene = |scene: &RecordedScene| {
        let mut worst = Worst::default();
        let file = if scene.text.is_some() { "scene.toml".to_owned() } else { format!("{}.toml", scene.name) };
        let given: Vec<_> = scene.text.iter().map(|text| ("scene.toml", text.as_str())).collect();
        for command in ["solve", "critical"] {
            let is_critical = |path: &str| ["critical_", "dimensionless_", "eq15."].iter().any(|p| path.starts_with(p));
            let has_speed = scene.words.contains_key("outcome");
            let is_of = |path: &str| is_critical(path) == (command == "critical");
            if !scene.numbers.keys().any(|path| is_of(path)) || (command == "solve" && !has_speed) {
                continue;
            }
            let line = format!("{command} {file} --method {method} --json");
            let (said, _) = run(program, &line, &given)?;
            // Not every method takes every scene.
            if said.code == 2 {
                continue;
            }
            let answer = Answer::read(&line, &said)?;
            for (path, exact) in scene.numbers.iter().filter(|(path, _)| is_of(path)) {
                let exact: f64 = exact.parse()?;
                let condition = scene.condition.get(path).map_or(Ok(1.0), |text| text.parse::<f64>())?.max(10.0);
                let error = apart(answer.at(path).as_f64().unwrap_or(f64::NAN), exact) / condition;
                worst
                    .take(error, || format!("{path} of {command} {}: {} and not {exact}", scene.name, answer.at(path)));
            }
            if command == "solve" {
                for (path, word) in &scene.words {
                    let is_it = answer.at(path).as_str() == Some(word);
                    let place = || format!("{path} of {}: {} and not {word}", scene.name, answer.at(path));
                    worst.take(if is_it { 0.0 } else { f64::INFINITY }, place);
                }
                nothing_else(&answer, scene, &mut worst);
            }
        }
        Ok(worst)
    };
    let found = scenes.par_iter().step_by(*each).map(of_scene).collect::<Found<Vec<_>>>()?;
    let mut worst = Worst::default();
    for of in found {
        worst.take(of.value, || of.place);
    }
    Ok(worst.measurement())
}

/// What is recorded nowhere is `null`, and a coefficient zero. Of a scene that does not ship, numbers that others say again
/// are not recorded.
fn nothing_else(answer: &Answer, scene: &RecordedScene, worst: &mut Worst) {
    let is_whole = scene.text.is_none();
    for of in ["scene", "groups"].into_iter().filter(|_| is_whole) {
        let fields = answer.at(of).as_object().into_iter().flatten();
        for (name, value) in fields.filter(|(_, value)| value.is_number()) {
            let path = format!("{of}.{name}");
            let is_known = scene.numbers.contains_key(&path);
            worst.take(if is_known { 0.0 } else { f64::INFINITY }, || format!("{path} of {} is {value}", scene.name));
        }
    }
    for (i, stage) in answer.list("scene.stages").iter().enumerate() {
        for (name, value) in stage.as_object().into_iter().flatten() {
            let path = format!("scene.stages.{i}.{name}");
            let is_right = scene.numbers.contains_key(&path) || value.is_null() || value.as_f64() == Some(0.0);
            worst.take(if is_right { 0.0 } else { f64::INFINITY }, || format!("{path} of {} is {value}", scene.name));
        }
    }
}

/// What the text says, beside what the JSON says of it.
struct Reading<'a> {
    answer: &'a Answer,
    worst: Worst,
    seen: usize,
}

impl Reading<'_> {
    /// The text `printed` with `digits` significant digits is the number at `path`, times `factor`.
    fn number(&mut self, printed: Option<f64>, text: &str, path: &str, digits: i32) {
        let exact = self.answer.at(path).as_f64();
        self.is(printed, exact, text, path, digits);
    }

    fn is(&mut self, printed: Option<f64>, exact: Option<f64>, text: &str, path: &str, digits: i32) {
        let half_unit = |exact: f64| 0.5 * 10f64.powi(exact.abs().log10().floor() as i32 + 1 - digits);
        let off = match printed.zip(exact) {
            Some((printed, exact)) if printed == exact => 0.0,
            Some((printed, exact)) => (printed - exact).abs() / half_unit(exact),
            None => f64::INFINITY,
        };
        self.seen += 1;
        self.worst.take(off, || format!("{path}: `{text}` and not {exact:?}"));
    }

    fn word(&mut self, printed: &str, path: &str) {
        self.seen += 1;
        let exact = self.answer.at(path).as_str();
        let off = if exact == Some(printed) { 0.0 } else { f64::INFINITY };
        self.worst.take(off, || format!("{path}: `{printed}` and not {exact:?}"));
    }

    fn plain(&mut self, printed: &str, path: &str, digits: i32) {
        self.number(printed.parse().ok(), printed, path, digits);
    }

    fn measured(&mut self, words: &[&str], base: &str, path: &str) {
        let [number, unit] = words else { return self.plain("", path, 6) };
        self.number(with_unit(number, unit, base), number, path, 6);
    }

    fn solved(&mut self, text: &str) {
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                ["method", name, ..] => self.word(name.trim_end_matches(','), "method.name"),
                ["outcome", outcome, rest @ ..] => {
                    self.word(outcome, "outcome");
                    // In front of it stands the place of the exit.
                    let margin = rest.iter().position(|word| *word == "(exit").unwrap_or(rest.len());
                    if let ["(exit", "margin", margin, "+-", bound, ..] = &rest[margin..] {
                        self.plain(margin, "exit_margin", 6);
                        self.plain(bound, "exit_margin_error", 1);
                    }
                }
                ["groups", groups @ ..] => {
                    for pair in groups.chunks_exact(2) {
                        let name = format!("groups.{}", pair[0].replace('/', "_over_"));
                        self.plain(pair[1], &name, 6);
                    }
                }
                ["Eq.", "11-13", "X/d", ratio, .., johnson] => {
                    self.plain(ratio, "groups.X_over_d_eq11_12", 6);
                    self.plain(johnson, "groups.johnson", 6);
                }
                ["cost", steps, "steps,", rejected, "rejected,", evaluations, ..] => {
                    self.plain(steps, "cost.steps", 17);
                    self.plain(rejected, "cost.rejected_steps", 17);
                    self.plain(evaluations, "cost.force_evaluations", 17);
                }
                _ => {}
            }
        }
        let events = text.lines().skip_while(|line| !line.trim_start().starts_with("event ")).skip(1);
        for (i, line) in events.take_while(|line| !line.trim().is_empty()).enumerate() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let (name, numbers) = words.split_at(words.len().saturating_sub(6));
            self.word(name.first().unwrap_or(&""), &format!("events.{i}.event"));
            if let Some(stage) = name.get(1) {
                self.plain(stage, &format!("events.{i}.stage"), 17);
            }
            for (pair, (field, base)) in
                numbers.chunks(2).zip([("time_s", "s"), ("depth_m", "m"), ("velocity_m_s", "m/s")])
            {
                self.measured(pair, base, &format!("events.{i}.{field}"));
            }
        }
        for (name, field, base) in
            [("depth", "depth_m", "m"), ("time", "time_s", "s"), ("velocity", "velocity_m_s", "m/s")]
        {
            let rows = text.lines().skip_while(|line| !line.trim_start().starts_with("at the end")).take(4);
            for line in rows.filter(|line| line.split_whitespace().next() == Some(name)) {
                let words: Vec<&str> = line.split_whitespace().collect();
                let [_, ours @ .., a, b, error] = words.as_slice() else { continue };
                self.measured(ours, base, field);
                self.measured(&[a, b], base, &format!("closed_form.{field}"));
                if *error != "-" {
                    self.plain(error, &format!("relative_error.{name}"), 2);
                }
            }
        }
    }

    fn critical(&mut self, text: &str) {
        let ours = self.answer.at("dimensionless_energy").as_f64();
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                ["method", name, ..] => self.word(name.trim_end_matches(','), "method.name"),
                ["V_c", velocity, rest @ .., evaluations, "flights"] => {
                    self.plain(velocity, "critical_velocity_m_s", 17);
                    self.plain(evaluations, "evaluations", 17);
                    if let ["+-", bar, "m/s,"] = rest {
                        self.plain(bar, "error_bar_m_s", 2);
                    }
                }
                ["E_c", pair @ ..] if pair.len() == 2 => self.measured(pair, "J", "critical_energy_j"),
                ["exact", velocity, "m/s,", "relative", "error", error] => {
                    self.plain(velocity, "closed_form.critical_velocity_m_s", 17);
                    self.plain(error, "relative_error", 2);
                }
                ["simulation", value] => self.plain(value, "dimensionless_energy", 6),
                ["Eq.", "15,", name @ ("printed" | "unrounded"), value, over @ ..] => {
                    let path = format!("eq15.{name}");
                    self.plain(value, &path, 6);
                    if let [percent, "%"] = over {
                        let exact =
                            ours.zip(self.answer.at(&path).as_f64()).map(|(ours, of)| 100.0 * (ours / of - 1.0));
                        // One digit behind the point.
                        let off =
                            percent.parse::<f64>().ok().zip(exact).map_or(f64::INFINITY, |(p, e)| (p - e).abs() / 0.05);
                        self.worst.take(off, || format!("over {path}: {percent} % and not {exact:?}"));
                    }
                }
                _ => {}
            }
        }
    }
}

fn printed_text(subject: &Subject<'_>) -> Found {
    let (program, method) = (subject.program()?, subject.method_name());
    let readings = SHIPPED.par_iter().map(|(name, _)| {
        let mut worst = Worst::default();
        for (command, least) in [("solve", 8), ("critical", 3)] {
            let line = format!("{command} {name}.toml --method {method}");
            let (said, _) = run(program, &line, &[])?;
            if said.code == 2 {
                continue;
            }
            let answer = Answer::of(program, &line, &[])?;
            let mut reading = Reading { answer: &answer, worst: Worst::default(), seen: 0 };
            if command == "solve" {
                reading.solved(&said.out);
            } else {
                reading.critical(&said.out);
            }
            let title = answer.at("scene.title").as_str();
            let is_titled = title.is_none_or(|title| said.out.lines().next() == Some(title));
            let is_whole = reading.seen >= least && is_titled && covers(&answer, &said.out);
            holds!(is_whole, "`{line}` prints {} numbers with a label that is known: {}", reading.seen, said.out);
            worst.take(reading.worst.value, || format!("`{line}`, {}", reading.worst.place));
        }
        Ok(worst)
    });
    let mut worst = Worst::default();
    for of in readings.collect::<Found<Vec<_>>>()? {
        worst.take(of.value, || of.place);
    }
    Ok(worst.measurement())
}

/// Whether each event, and each part of the answer that is not `null`, has its lines in the text.
fn covers(answer: &Answer, text: &str) -> bool {
    let stands = |label: &str| text.lines().any(|line| line.trim_start().starts_with(label));
    let parts = [
        ("closed_form.depth_m", "at the end"),
        ("exit_margin_error", "outcome"),
        ("groups.I", "groups"),
        ("critical_energy_j", "E_c "),
        ("closed_form.critical_energy_j", "exact "),
        ("dimensionless_energy", "simulation"),
    ];
    let events = answer.list("events").iter().filter_map(|event| event.get("event").and_then(Value::as_str));
    parts.iter().all(|(path, label)| answer.at(path).is_null() || stands(label)) && events.into_iter().all(stands)
}
