//! Numbers that one command prints beside those of another, or beside the definition of what they name.

use std::f64::consts::PI;

use rayon::prelude::*;
use serde_json::Value;

use super::answer::{Answer, Table, apart, of, run};
use crate::integrators::MethodName;
use crate::suite::checks::{LAWS, Subject, Worst, complete_build};
use crate::suite::claim::{Found, NotMeasured};
use crate::suite::program::Said;

check! {
    /// Rows of a trajectory: the force is the law of its stage there, the first row the start, the last the end, and each
    /// event has a row.
    PathRows {
        /// Options of the method.
        options: String,
    } in Commands, "relative", by path_rows, compares (Commands | Itself);

    /// Rows of a trajectory: the force over the time is the change of momentum, the velocity over it the distance.
    PathMomentum {
        /// Options of the method.
        options: String,
    } in Commands, "relative", by path_momentum, compares (Commands | Itself);

    /// `--rtol`: the error falls with it and stays beside it, and nothing of the scene moves.
    Tolerance {} in Commands, "violations", by tolerance, compares (Commands | Elsewhere);

    /// `--dt`, `--velocity`, `--events`: distance of the order between two steps, a quarter apart, from `order`; the
    /// options are those asked for, and events stand where the rule puts them.
    StepOption {
        /// Order of the depth.
        order: f64,
        /// The longer step (s).
        step: f64,
    } in Commands, "order", by step_option, compares (Commands | Itself);

    /// `--sensitivities`: elasticities against central differences of `solve --set` and `critical --set`.
    Slopes {
        /// Relative change of each number.
        by: f64,
    } in Commands, "relative", by slopes, compares (Duals | Itself);

    /// `critical --spread`: first order and shares from the elasticities of `solve --sensitivities`.
    SpreadParts {
        /// Spreads, `PATH=REL`.
        spreads: Vec<String>,
    } in Commands, "relative", by spread_parts, compares (Commands | Itself);

    /// `critical --spread`: distance of the sampled mean and deviation from first order, in what so many samples leave.
    SpreadSamples {
        /// Spreads, `PATH=REL`.
        spreads: Vec<String>,
    } in Commands, "standard errors", by spread_samples, compares (Commands | Itself);

    /// `bench`: of the text, the least error of each method and the setting that reaches each level, by the runs in JSON.
    BenchLevels {} in Commands, "relative", by bench_levels, compares (Commands | Itself);

    /// `bench`: each point of the figures of cost and growth is a run in JSON, and each run a point; times of scenes are those of
    /// the runs over the scenes, and memory is in whole pages.
    BenchFigures {} in Commands, "relative", by bench_figures, compares (Commands | Itself);

    /// Each column of `batch` on random rows against `solve` and `critical` on the same numbers.
    BatchRows {
        /// Rows.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        rows: usize,
    } in Commands, "relative", by batch_rows, compares nothing;

    /// Rows of `batch --scene` that vary speed and mass against `solve --set` on the same numbers.
    BatchOfScene {
        /// Rows.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        rows: usize,
    } in Commands, "relative", by batch_of_scene, compares nothing;

    /// `critical` and `solve` by enclosure: each number beside an interval is its middle, the error bar of V_c half of its width,
    /// E_c = M V_c²/2 of that.
    MiddleAndBar {
        /// Shipped scenes.
        of: Vec<String>,
    } in Commands, "violations", by middle_and_bar, compares (Commands | Itself);

    /// Rows of `sweep` against `solve --set` and `critical --set` at the values that the axis asks for.
    SweepRows {
        /// What varies.
        path: String,
        /// First value.
        from: f64,
        /// Last value.
        to: f64,
        /// Whether the ratio of two values is the same.
        log: bool,
    } in Commands, "relative", by sweep_rows, compares nothing;

    /// Points of `map`: the error of Eq. 11-12 there, from both formulas, against the level of its line.
    MapLines {
        /// Crater depth in diameters.
        k: f64,
    } in Commands, "relative", by map_lines, compares (Commands | Itself);

    /// `experiments`: each test against `solve` on its scene, and the numbers of each set by their definitions, in JSON, in
    /// the table and in text.
    SetsOfTests {} in Commands, "relative", by sets_of_tests, compares (Commands | Itself);

    /// `converge`: each error is that of `solve` with the same step; the order is the slope of the errors used.
    StepErrors {
        /// Options: rules, steps, points.
        options: String,
    } in Commands, "relative", by step_errors, compares (Commands | Itself);

    /// `audit`: the three grids by the procedure of Celik et al. (2008), from the table itself.
    ThreeGridRule {
        /// Steps, from fine to coarse.
        steps: [f64; 3],
        /// Values.
        values: [f64; 3],
    } in Commands, "relative", by three_grid_rule, compares (Commands | Itself);
}

/// Whether `holds`: no error, or one beyond any limit.
fn must(holds: bool) -> f64 {
    if holds { 0.0 } else { f64::INFINITY }
}

/// The force of a stage (SI).
fn force(stage: &Value, depth: f64, velocity: f64) -> f64 {
    let [p, s, r, q] = ["static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m"].map(|name| of(stage, name));
    p + s * depth + r * velocity + q * velocity * velocity
}

/// A row of a trajectory.
struct PathRow {
    time: f64,
    depth: f64,
    velocity: f64,
    force: f64,
    stage: usize,
}

/// A flight with its trajectory.
fn path(options: &str, subject: &Subject<'_>) -> Found<(Answer, Vec<PathRow>)> {
    let (scene, method) = (subject.shipped_scene()?, subject.method_name());
    applies!(subject.problem()?.laws.is_empty(), "{LAWS}");
    let rules = match method {
        MethodName::CentralDifference => {
            format!("--velocity {} --events {}", subject.velocity(), subject.boundaries())
        }
        _ => String::new(),
    };
    let line = format!("solve {scene}.toml --method {method} {rules} {options} --trajectory path.csv");
    let (answer, files) = Answer::and_files(subject.program()?, &line, &[])?;
    let table = Table::read(files.first().map_or("", |(_, text)| text))?;
    let rows = table.rows.iter().map(|row| {
        let number = |name| table.number(row, name);
        let (time, depth, velocity) = (number("time_s")?, number("depth_m")?, number("velocity_m_s")?);
        Ok(PathRow { time, depth, velocity, force: number("force_n")?, stage: table.cell(row, "stage")?.parse()? })
    });
    Ok((answer, rows.collect::<Found<_>>()?))
}

fn path_rows(PathRows { options }: &PathRows, subject: &Subject<'_>) -> Found {
    let (answer, rows) = path(options, subject)?;
    holds!(rows.len() > 1, "{} rows", rows.len());
    let mut worst = Worst::default();
    let largest = rows.iter().fold(0.0, |largest: f64, row| largest.max(row.force.abs()));
    for (i, row) in rows.iter().enumerate() {
        let law = force(answer.at(&format!("scene.stages.{}", row.stage)), row.depth, row.velocity);
        worst.take((row.force - law).abs() / largest, || format!("row {i}: {} N in place of {law} N", row.force));
    }
    let states = |object: &Value| [of(object, "time_s"), of(object, "depth_m"), of(object, "velocity_m_s")];
    let is_at = |row: &PathRow, state: [f64; 3]| [row.time, row.depth, row.velocity] == state;
    let start = [0.0, 0.0, answer.number("scene.velocity_m_s")?];
    worst.take(must(is_at(&rows[0], start)), || "the first row is not the start".to_owned());
    worst.take(must(is_at(&rows[rows.len() - 1], states(&answer.json))), || "the last row is not the end".to_owned());
    for event in answer.list("events") {
        let stands = rows.iter().any(|row| is_at(row, states(event)));
        worst.take(must(stands), || format!("no row for {event}"));
    }
    let is_ordered = rows.windows(2).all(|w| w[0].time <= w[1].time && w[0].stage <= w[1].stage);
    worst.take(must(is_ordered), || "the rows are not in the order of time".to_owned());
    Ok(worst.measurement())
}

fn path_momentum(PathMomentum { options }: &PathMomentum, subject: &Subject<'_>) -> Found {
    let (answer, rows) = path(options, subject)?;
    let (mass, speed) = (answer.number("scene.mass_kg")?, answer.number("scene.velocity_m_s")?);
    let mut worst = Worst::default();
    let (mut impulse, mut distance) = (0.0, 0.0);
    for (i, pair) in rows.windows(2).enumerate() {
        let [from, to] = pair else { continue };
        let law = answer.at(&format!("scene.stages.{}", to.stage));
        let mean = 0.5 * (force(law, from.depth, from.velocity) + force(law, to.depth, to.velocity));
        impulse += mean * (to.time - from.time);
        distance += 0.5 * (from.velocity + to.velocity) * (to.time - from.time);
        let lost = speed - to.velocity;
        worst.take((impulse / mass - lost).abs() / speed, || format!("row {}: {lost} m/s lost", i + 1));
        worst.take((distance / to.depth - 1.0).abs(), || format!("row {}: at {} m", i + 1, to.depth));
    }
    Ok(worst.measurement())
}

fn tolerance(subject: &Subject<'_>) -> Found {
    let (program, scene, method) = (subject.program()?, subject.shipped_scene()?, subject.method_name());
    let plain = Answer::of(program, &format!("solve {scene}.toml --method {method}"), &[])?;
    let mut seen = Vec::new();
    let mut before = f64::INFINITY;
    for rtol in ["1e-3", "1e-6", "1e-9"] {
        let answer = Answer::of(program, &format!("solve {scene}.toml --method {method} --rtol {rtol}"), &[])?;
        let asked: f64 = rtol.parse()?;
        let error = ["depth", "time"].iter().map(|name| of(answer.at("relative_error"), name)).fold(0.0, f64::max);
        if answer.number("method.rtol")? != asked {
            seen.push(format!("rtol {rtol} is not {}", answer.at("method.rtol")));
        }
        // A method of variable order does better than asked for, never a thousand times worse.
        if !(error < 1e3 * asked && error < 0.9 * before) {
            seen.push(format!("error {error:e} at rtol {rtol}, before {before:e}"));
        }
        if answer.at("scene") != plain.at("scene") || answer.at("closed_form") != plain.at("closed_form") {
            seen.push(format!("--rtol {rtol} changes the scene or its closed form"));
        }
        before = error;
    }
    let count = seen.len();
    Ok(crate::suite::Measurement::count(count).remark(seen.into_iter().next().unwrap_or_default()))
}

fn step_option(StepOption { order, step }: &StepOption, subject: &Subject<'_>) -> Found {
    let (program, scene) = (subject.program()?, subject.shipped_scene()?);
    let [velocity, events] = [subject.velocity().name(), subject.boundaries().name()];
    let mut errors = Vec::new();
    let mut worst = Worst::default();
    for dt in [*step, step / 4.0] {
        let options = format!("--method central-difference --dt {dt:e} --velocity {velocity} --events {events}");
        let answer = Answer::of(program, &format!("solve {scene}.toml {options}"), &[])?;
        errors.push(answer.number("relative_error.depth")?);
        let is_asked = answer.number("method.dt_s")? == dt
            && answer.at("method.velocity") == velocity
            && answer.at("method.events") == events;
        worst.take(must(is_asked), || format!("`{options}` gives {}", answer.at("method")));
        let end = answer.number("scene.stages.0.end_m")?;
        for event in answer.list("events") {
            let steps = of(event, "time_s") / dt;
            let is_whole = (steps - steps.round()).abs() < 1e-6;
            let is_right = if event["event"] == "crater-end" {
                let (is_past, is_there) = (of(event, "depth_m") > end, apart(of(event, "depth_m"), end) < 1e-12);
                if events == "step-end" { is_whole && is_past } else { !is_whole && is_there }
            } else {
                is_whole == (events == "step-end")
            };
            worst.take(must(is_right), || format!("under {events}, step {dt:e} s: {event}"));
        }
    }
    let found = (errors[0] / errors[1]).ln() / 4f64.ln();
    worst.take((found - order).abs(), || format!("order {found:.3} in place of {order}"));
    Ok(worst.measurement())
}

fn slopes(Slopes { by }: &Slopes, subject: &Subject<'_>) -> Found {
    let (program, scene, method) = (subject.program()?, subject.shipped_scene()?, subject.method_name());
    let answer = Answer::of(program, &format!("solve {scene}.toml --sensitivities --method {method}"), &[])?;
    let mut centres = Vec::new();
    for of in ["solve", "critical"] {
        let (said, _) = run(program, &format!("{of} {scene}.toml --json"), &[])?;
        centres.push(if said.code == 2 { None } else { Some(Answer::read(of, &said)?) });
    }
    let centre = |of: &str| centres[usize::from(of == "critical")].as_ref();
    let quantities = [
        ("solve", "depth", "depth_m"),
        ("solve", "velocity", "velocity_m_s"),
        ("critical", "critical_velocity", "critical_velocity_m_s"),
    ];
    let of_parameter = |parameter: &Value| {
        let mut worst = Worst::default();
        let (path, value) = (parameter["path"].as_str().unwrap_or_default(), of(parameter, "value"));
        for (command, name, field) in quantities.iter().filter(|(_, name, _)| !parameter[*name].is_null()) {
            let at = |factor: f64| {
                let line = format!("{command} {scene}.toml --set {path}={:?} --json", value * factor);
                let (said, _) = run(program, &line, &[])?;
                // A number at the end of its range.
                if said.code == 2 { Ok(None) } else { Answer::read(&line, &said)?.number(field).map(Some) }
            };
            let centre = centre(command).map_or(Ok(f64::NAN), |answer| answer.number(field))?;
            let slope = of(&parameter[*name], "derivative");
            let elasticity = of(&parameter[*name], "elasticity");
            let found = if value == 0.0 {
                elasticity
            } else {
                let (Some(above), Some(below)) = (at(1.0 + by)?, at(1.0 - by)?) else { continue };
                (above / centre).ln() - (below / centre).ln()
            };
            let width = if value == 0.0 { 1.0 } else { by.ln_1p() - (-by).ln_1p() };
            let place = || format!("d {name}/d {path}: {elasticity} in place of {}", found / width);
            worst.take((found / width - elasticity).abs(), place);
            worst.take(apart(slope * value / centre, elasticity), || format!("elasticity of {name} to {path}"));
        }
        Ok(worst)
    };
    let parameters = answer.list("sensitivities.parameters");
    let is_concrete = subject.scene()?.concrete().is_some();
    applies!(is_concrete || parameters.len() > 3, "{} numbers with a slope are too few", parameters.len());
    holds!(parameters.len() > 3, "{} numbers", parameters.len());
    let mut worst = Worst::default();
    for of in parameters.par_iter().map(of_parameter).collect::<Found<Vec<_>>>()? {
        worst.take(of.value, || of.place);
    }
    Ok(worst.measurement())
}

/// `critical --spread` of `spreads`, and the relative deviation of V_c that each makes, by the elasticities of `solve`.
fn spread(spreads: &[String], seed: u64, subject: &Subject<'_>) -> Found<(Answer, Vec<f64>)> {
    let (program, scene) = (subject.program()?, subject.shipped_scene()?);
    let asked = spreads.iter().fold(String::new(), |asked, spread| asked + " --spread " + spread);
    let answer = Answer::of(program, &format!("critical {scene}.toml{asked} --samples 4000 --seed {seed}"), &[])?;
    let slopes = Answer::of(program, &format!("solve {scene}.toml --sensitivities"), &[])?;
    let parts = spreads.iter().map(|spread| {
        let (path, relative) = spread.split_once('=').unwrap_or((spread, ""));
        let entry = slopes.list("sensitivities.parameters").iter().find(|entry| entry["path"] == path);
        let elasticity = entry.and_then(|entry| entry["critical_velocity"]["elasticity"].as_f64());
        let elasticity = elasticity.ok_or_else(|| NotMeasured::skip(format!("no slope of V_c over {path}")))?;
        Ok(elasticity * relative.trim_end_matches('%').parse::<f64>()? / 100.0)
    });
    Ok((answer, parts.collect::<Found<_>>()?))
}

fn spread_parts(SpreadParts { spreads }: &SpreadParts, subject: &Subject<'_>) -> Found {
    let (answer, parts) = spread(spreads, 1, subject)?;
    let mut worst = Worst::default();
    let variance: f64 = parts.iter().map(|part| part * part).sum();
    let first = variance.sqrt() * answer.number("critical_velocity_m_s")?;
    worst.take(apart(answer.number("uncertainty.first_order_m_s")?, first), || {
        format!("of the deviation of V_c, which is {first} m/s by the slopes")
    });
    let shares = answer.list("uncertainty.spreads");
    holds!(shares.len() == parts.len(), "{} shares", shares.len());
    for ((share, part), spread) in shares.iter().zip(&parts).zip(spreads) {
        let is_named = spread.split_once('=').is_some_and(|(path, _)| share["path"] == path);
        worst.take(must(is_named), || format!("{share} in place of {spread}"));
        worst.take(apart(of(share, "share"), part * part / variance), || format!("share of {spread}: {share}"));
    }
    Ok(worst.measurement())
}

fn spread_samples(SpreadSamples { spreads }: &SpreadSamples, subject: &Subject<'_>) -> Found {
    let seed = subject.context.seed;
    let [(answer, _), (other, _)] = [spread(spreads, seed, subject)?, spread(spreads, seed.wrapping_add(1), subject)?];
    let mut worst = Worst::default();
    let number = |name: &str| answer.number(&format!("uncertainty.{name}"));
    let (centre, first, samples) = (answer.number("critical_velocity_m_s")?, number("first_order_m_s")?, 4000.0_f64);
    let (mean, deviation) = (number("mean_m_s")?, number("deviation_m_s")?);
    let error = first / samples.sqrt();
    // What the curvature adds is a part of the square of the deviation over V_c.
    worst.take((mean - centre).abs() / (error + first * first / centre), || {
        format!("mean {mean} m/s, V_c {centre} m/s")
    });
    let allowed = error / 2f64.sqrt() + 2.0 * first * first / centre;
    worst.take((deviation - first).abs() / allowed, || format!("deviation {deviation} m/s, first order {first} m/s"));
    for (i, z) in [-1.959_964, 0.0, 1.959_964].into_iter().enumerate() {
        let (quantile, normal) = (number(&format!("quantiles_m_s.{i}"))?, centre * (z * first / centre).exp());
        // The density at 97.5 % is 0.0585 of the deviation; at the median 0.399.
        let error = if i == 1 { 1.25 * error } else { 2.67 * error } + 2.0 * first * first / centre;
        worst.take((quantile - normal).abs() / error, || format!("quantile {quantile} m/s, normal {normal} m/s"));
    }
    worst.take(must(number("samples")? == samples && number("inadmissible")? == 0.0), || "not 4000 samples".to_owned());
    worst.take(must(number("seed")? == seed as f64), || format!("seed {}", answer.at("uncertainty.seed")));
    let moved = other.number("uncertainty.mean_m_s")? != mean;
    worst.take(must(moved), || "another seed gives the same mean".to_owned());
    let kept = other.at("uncertainty.first_order_m_s") == answer.at("uncertainty.first_order_m_s");
    worst.take(must(kept), || "another seed moves the first order".to_owned());
    Ok(worst.measurement())
}

fn batch_rows(BatchRows { rows }: &BatchRows, subject: &Subject<'_>) -> Found {
    let (program, method) = (subject.program()?, subject.method_name());
    let mut random = subject.random(&subject.claim.id);
    let mut table = "velocity_m_s,mass_kg,diameter_m,nose_factor,strength_pa,density_kg_m3,thickness_m,S,B,k,\
                     crater_stiffness_n_m,criterion\n"
        .to_owned();
    let mut texts = Vec::new();
    for _ in 0..*rows {
        let diameter = random.uniform(0.02, 0.1);
        let (mass, nose) = (random.log_uniform(3e3, 3e4) * diameter.powi(3), random.uniform(0.02, 1.0));
        let (strength, density) = (random.log_uniform(2e7, 1.5e8), random.uniform(1900.0, 2700.0));
        let velocity = random.uniform(60.0, 700.0);
        let mut maybe = |low: f64, high: f64| random.chance(0.5).then(|| random.uniform(low, high));
        let [factor, inertia, k] = [maybe(5.0, 14.0), maybe(0.7, 1.3), maybe(0.4, 3.0)];
        let [thickness, stiffness] = [maybe(0.5 * diameter, 9.0 * diameter), maybe(4e6, 4e7)];
        let is_ndrc = thickness.is_some() && random.chance(0.3);
        let cells =
            [thickness, factor, inertia, k, stiffness].map(|cell| cell.map_or(String::new(), |n| format!("{n:?}")));
        let criterion = if is_ndrc { "ndrc" } else { "" };
        table.push_str(&format!(
            "{velocity:?},{mass:?},{diameter:?},{nose:?},{strength:?},{density:?},{},{criterion}\n",
            cells.join(",")
        ));
        let line = |key: &str, value: Option<f64>| value.map_or(String::new(), |value| format!("{key} = {value:?}\n"));
        texts.push((
            format!(
                "[projectile]\nmass = {mass:?}\ndiameter = {diameter:?}\nnose = {{ factor = {nose:?} }}\n[target]\nstrength \
                 = {strength:?}\ndensity = {density:?}\n{}[resistance]\n{}{}{}{}[impact]\nvelocity = {velocity:?}\n{}",
                line("thickness", thickness),
                line("S", factor),
                line("B", inertia),
                line("k", k),
                line("crater_stiffness", stiffness),
                if is_ndrc { "[perforation]\ncriterion = \"ndrc\"\n" } else { "" }
            ),
            thickness.is_some(),
        ));
    }
    let line = format!("batch in.csv --out r.csv --critical --method {method}");
    let (said, files) = run(program, &line, &[("in.csv", &table)])?;
    holds!(said.code == 0, "`{line}` exits {} {}", said.code, said.err);
    let table = Table::read(files.first().map_or("", |(_, text)| text))?;
    holds!(table.rows.len() == *rows, "{} rows of {rows}", table.rows.len());
    let of_row = |(i, (text, has_exit)): (usize, &(String, bool))| {
        let mut worst = Worst::default();
        let row = &table.rows[i];
        let given = [("scene.toml", text.as_str())];
        let answer = Answer::of(program, &format!("solve scene.toml --method {method}"), &given)?;
        let crater = answer.list("events").iter().find(|event| event["event"] == "crater-end");
        let critical = if *has_exit {
            Answer::of(program, &format!("critical scene.toml --method {method}"), &given)?
                .number("critical_velocity_m_s")?
        } else {
            f64::NAN
        };
        let of_crater = |name| crater.map_or(f64::NAN, |event| of(event, name));
        // Velocities are known beside V0, margins beside one.
        let speed = answer.number("scene.velocity_m_s")?;
        for (name, exact, scale) in [
            ("row", i as f64 + 1.0, 0.0),
            ("depth_m", answer.number("depth_m")?, 0.0),
            ("time_s", answer.number("time_s")?, 0.0),
            ("velocity_m_s", answer.number("velocity_m_s")?, speed),
            ("crater_end_time_s", of_crater("time_s"), 0.0),
            ("crater_end_velocity_m_s", of_crater("velocity_m_s"), speed),
            ("exit_margin", of(&answer.json, "exit_margin"), 1.0),
            ("critical_velocity_m_s", critical, 0.0),
        ] {
            let value = table.number(row, name)?;
            let off = apart(value, exact);
            let off = if off > 0.0 && off.is_finite() { off * (exact / scale).abs().min(1.0) } else { off };
            worst.take(off, || format!("{name} of row {}: {value} and not {exact}", i + 1));
        }
        let is_same = Some(table.cell(row, "outcome")?) == answer.at("outcome").as_str();
        worst.take(must(is_same && table.cell(row, "error")?.is_empty()), || format!("outcome of row {}", i + 1));
        Ok(worst)
    };
    let mut worst = Worst::default();
    for of in texts.par_iter().enumerate().map(of_row).collect::<Found<Vec<_>>>()? {
        worst.take(of.value, || of.place);
    }
    Ok(worst.measurement())
}

fn batch_of_scene(BatchOfScene { rows }: &BatchOfScene, subject: &Subject<'_>) -> Found {
    let (program, scene) = (subject.program()?, subject.shipped_scene()?);
    let plain = Answer::of(program, &format!("solve {scene}.toml"), &[])?;
    let (speed, mass) = (plain.number("scene.velocity_m_s")?, plain.number("scene.mass_kg")?);
    let mut random = subject.random(&subject.claim.id);
    // Some rows vary the speed alone.
    let mut row = |i: usize| {
        let mass =
            if i.is_multiple_of(3) { String::new() } else { format!("{:?}", mass * random.log_uniform(0.5, 2.0)) };
        (format!("{:?}", speed * random.log_uniform(0.2, 3.0)), mass)
    };
    let given: Vec<(String, String)> = (0..*rows).map(&mut row).collect();
    let lines: Vec<String> = given.iter().map(|(speed, mass)| format!("{speed},{mass}")).collect();
    let table = format!("impact.velocity,projectile.mass\n{}\n", lines.join("\n"));
    let line = format!("batch in.csv --scene {scene}.toml --out r.csv");
    let (said, files) = run(program, &line, &[("in.csv", &table)])?;
    holds!(said.code == 0, "`{line}` exits {} {}", said.code, said.err);
    let table = Table::read(files.first().map_or("", |(_, text)| text))?;
    holds!(table.rows.len() == *rows, "{} rows of {rows}", table.rows.len());
    let mut worst = Worst::default();
    for (row, (speed, mass)) in table.rows.iter().zip(&given) {
        let mass = if mass.is_empty() { String::new() } else { format!(" --set projectile.mass={mass}") };
        let answer = Answer::of(program, &format!("solve {scene}.toml --set impact.velocity={speed}{mass}"), &[])?;
        for name in ["depth_m", "time_s", "velocity_m_s", "exit_margin"] {
            let (value, exact) = (table.number(row, name)?, of(&answer.json, name));
            worst.take(apart(value, exact), || format!("{name} at {speed} m/s{mass}: {value} and not {exact}"));
        }
        let is_same = Some(table.cell(row, "outcome")?) == answer.at("outcome").as_str();
        worst.take(must(is_same), || format!("outcome at {speed} m/s{mass}"));
    }
    Ok(worst.measurement())
}

fn sweep_rows(SweepRows { path, from, to, log }: &SweepRows, subject: &Subject<'_>) -> Found {
    const POINTS: usize = 5;
    let (program, scene) = (subject.program()?, subject.shipped_scene()?);
    applies!(subject.problem()?.laws.is_empty(), "{LAWS}");
    let axis = format!("{path}={from:?}:{to:?}:{POINTS}{}", if *log { ":log" } else { "" });
    let (answer, files) = Answer::and_files(program, &format!("sweep {scene}.toml --vary {axis} --out s.csv"), &[])?;
    let table = files.iter().find(|(name, _)| name == "s.csv").map_or("", |(_, text)| text);
    let table = Table::read(table)?;
    let rows = answer.list("rows");
    holds!(rows.len() == POINTS && table.rows.len() == POINTS, "{} rows of {POINTS}", rows.len());
    let plain = Answer::of(program, &format!("critical {scene}.toml"), &[])?;
    let (diameter, mass) = (plain.number("scene.diameter_m")?, plain.number("scene.mass_kg")?);
    let strength = plain.number("scene.strength_pa")?;
    let of_row = |i: usize| {
        let mut worst = Worst::default();
        let (row, share) = (&rows[i], i as f64 / (POINTS - 1) as f64);
        let value = if *log { from * (to / from).powf(share) } else { from + (to - from) * share };
        let shown = row["values"][0].as_f64().unwrap_or(f64::NAN);
        worst.take(apart(shown, value), || format!("value {shown} and not {value}"));
        // The group moves the thickness, and nothing else.
        let set = if path == "H/d" {
            format!("target.thickness={:?}", shown * diameter)
        } else {
            format!("{path}={shown:?}")
        };
        let solved = Answer::of(program, &format!("solve {scene}.toml --set {set}"), &[])?;
        let critical = Answer::of(program, &format!("critical {scene}.toml --set {set}"), &[])?;
        let mass = if path == "projectile.mass" { shown } else { mass };
        let scale = if path == "projectile.diameter" { shown } else { diameter }.powi(3)
            * if path == "target.strength" { shown } else { strength };
        let speed = of(row, "critical_velocity_m_s");
        let over = |name: &str| of(row, "dimensionless_energy") / of(row, name) - 1.0;
        for (name, exact) in [
            ("depth_m", solved.number("depth_m")?),
            ("velocity_m_s", solved.number("velocity_m_s")?),
            ("critical_velocity_m_s", critical.number("critical_velocity_m_s")?),
            ("critical_energy_j", 0.5 * mass * speed * speed),
            ("dimensionless_energy", 0.5 * mass * speed * speed / scale),
            ("eq15_printed", critical.number("eq15.printed")?),
            ("eq15_unrounded", critical.number("eq15.unrounded")?),
            ("difference_printed", over("eq15_printed")),
            ("difference_unrounded", over("eq15_unrounded")),
        ] {
            let value = of(row, name);
            worst.take(apart(value, exact), || format!("{name} at {set}: {value} and not {exact}"));
            let cell = table.number(&table.rows[i], name)?;
            worst.take(apart(cell, value), || format!("{name} at {set} in the table: {cell} and not {value}"));
        }
        worst.take(must(row["outcome"] == *solved.at("outcome")), || format!("outcome at {set}: {}", row["outcome"]));
        if path == "H/d" {
            let cell = table.number(&table.rows[i], "H/d")?;
            worst.take(apart(cell, value), || format!("H/d {cell} and not {value}"));
            let at = |criterion: &str| {
                let line = format!("critical {scene}.toml --set {set} --set perforation.criterion={criterion}");
                Answer::of(program, &line, &[])?.number("dimensionless_energy")
            };
            for (name, exact) in [("energy_full_depth", at("full-depth")?), ("energy_ndrc", at("ndrc")?)] {
                worst.take(apart(of(row, name), exact), || {
                    format!("{name} at {set}: {} and not {exact}", of(row, name))
                });
            }
        }
        Ok(worst)
    };
    let mut worst = Worst::default();
    for of in (0..POINTS).into_par_iter().map(of_row).collect::<Found<Vec<_>>>()? {
        worst.take(of.value, || of.place);
    }
    Ok(worst.measurement())
}

/// Error of Eq. 11-12 against the equation of motion (`docs/theory.md`, section 3), each written out.
fn formula_error(impact: f64, geometry: f64, k: f64) -> f64 {
    let edge = 0.25 * PI * k;
    // V1² over S fc d³/M where the crater ends.
    let square = (impact - edge) / (1.0 + edge / geometry);
    let (formula, motion) = if impact <= edge {
        let slope = (1.0 + square / geometry) / k;
        ((4.0 * k * impact / PI).sqrt(), (4.0 * impact / (PI * slope)).sqrt())
    } else {
        (0.5 * k + 2.0 * impact / PI, k + 2.0 * geometry / PI * (square / geometry).ln_1p())
    };
    formula / motion - 1.0
}

fn map_lines(MapLines { k }: &MapLines, subject: &Subject<'_>) -> Found {
    let program = subject.program()?;
    let (answer, files) = Answer::and_files(program, &format!("map --k {k:?} --out m.csv"), &[])?;
    let table = Table::read(files.iter().find(|(name, _)| name == "m.csv").map_or("", |(_, text)| text))?;
    let mut worst = Worst::default();
    let mut points = Vec::new();
    for line in answer.list("lines") {
        for point in line["points"].as_array().into_iter().flatten() {
            points.push([
                of(line, "level"),
                point[0].as_f64().unwrap_or(f64::NAN),
                point[1].as_f64().unwrap_or(f64::NAN),
            ]);
        }
    }
    holds!(points.len() > 1000 && points.len() == table.rows.len(), "{} points", points.len());
    for (point, row) in points.iter().zip(&table.rows) {
        let [level, impact, geometry] = *point;
        let error = formula_error(impact, geometry, *k);
        worst.take(apart(error.abs(), level), || format!("error {error} at I = {impact}, N = {geometry}"));
        for (name, number) in ["level", "I", "N"].iter().zip(point) {
            worst.take(apart(table.number(row, name)?, *number), || format!("{name} of a point in the table"));
        }
    }
    let scenes = answer.list("scenes");
    holds!(scenes.len() > 100, "{} tests", scenes.len());
    for scene in scenes {
        let error = formula_error(of(scene, "I"), of(scene, "N"), of(scene, "k"));
        worst.take((of(scene, "error") - error).abs(), || format!("error of {scene} and not {error}"));
    }
    // The table for people: the least N of each level, six digits.
    let (said, _) = run(program, &format!("map --k {k:?}"), &[])?;
    let mut cells = 0;
    for line in said.out.lines() {
        let numbers: Vec<Option<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        let [Some(impact), rest @ ..] = numbers.as_slice() else { continue };
        for (geometry, level) in rest.iter().zip([0.01, 0.05, 0.2]).filter_map(|(cell, level)| Some(((*cell)?, level)))
        {
            // Six digits of N are a part of the error that the slope of the error says: less than ten times theirs.
            let error = formula_error(*impact, geometry, *k).abs();
            let off = apart(error, level);
            worst.take(if off < 5e-4 { 0.0 } else { off }, || format!("error {error} at I = {impact}, N = {geometry}"));
            cells += 1;
        }
    }
    holds!(cells > 30, "{cells} cells of the table");
    Ok(worst.measurement())
}

/// A test of a measured set: set, M (kg), d (mm), caliber-radius-head (none: flat), fc (MPa), rho (kg/m³), V0 (m/s), depth and
/// its uncertainty (mm).
type MeasuredTest = (&'static str, f64, f64, Option<f64>, f64, f64, f64, f64, f64);

const TESTS: [MeasuredTest; 9] = [
    ("a", 1.6, 30.5, Some(3.0), 23.0, 2040.0, 500.0, 860.0, 15.0),
    ("a", 1.6, 30.5, Some(3.0), 23.0, 2040.0, 650.0, 1180.0, 15.0),
    ("a", 1.6, 30.5, Some(3.0), 38.0, 2310.0, 800.0, 1540.0, 20.0),
    ("a", 1.6, 30.5, Some(4.25), 23.0, 2040.0, 800.0, 1190.0, 20.0),
    ("b", 8.0, 76.0, None, 40.0, 2300.0, 120.0, 55.0, 5.0),
    ("b", 8.0, 75.0, None, 40.0, 2300.0, 240.0, 130.0, 5.0),
    ("b", 8.0, 76.0, None, 140.0, 2300.0, 60.0, 12.0, 5.0),
    ("b", 6.0, 76.0, None, 36.0, 2300.0, 180.0, 90.0, 4.0),
    ("b", 8.0, 76.0, None, 36.0, 2300.0, 80.0, 30.0, 4.0),
];

/// The test as a scene, by what `docs/reference.md` says of its S, k and N*.
fn scene_of((_, mass, d, head, fc, density, speed, ..): &MeasuredTest) -> String {
    let nose =
        head.map_or("shape = \"flat\"".to_owned(), |head| format!("shape = \"ogive\", caliber_radius_head = {head:?}"));
    let height = head.map_or(0.0, |head| (head - 0.25).sqrt());
    format!(
        "[projectile]\nmass = {mass:?}\ndiameter = \"{d} mm\"\nnose = {{ {nose} }}\n[target]\nstrength = \"{fc} MPa\"\ndensity \
         = {density:?}\n[resistance]\nk = {:?}\n[impact]\nvelocity = {speed:?}\n",
        0.707 + height
    )
}

/// Number `index` of the list `value`.
fn of_end(value: &Value, index: usize) -> f64 {
    value[index].as_f64().unwrap_or(f64::NAN)
}

#[expect(clippy::too_many_lines, reason = "one definition behind the other, each beside the number it makes")]
fn sets_of_tests(subject: &Subject<'_>) -> Found {
    const SPREADS: [(&str, f64); 2] = [("target.strength", 0.1), ("impact.velocity", 0.01)];
    let program = subject.program()?;
    let rows = TESTS.map(|(set, mass, d, head, fc, density, speed, depth, uncertainty)| {
        let nose = head.map_or("flat,".to_owned(), |head| format!("ogive,{head}"));
        format!("{set},{mass},{d},{nose},{fc},{density},{speed},{depth},{uncertainty}\n")
    });
    let header = "test_set,M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,V0_m_s,depth_mm,depth_uncertainty_mm\n";
    let own = header.to_owned() + &rows.concat();
    let given = [("own.csv", own.as_str())];
    let options = "own.csv --spread target.strength=10% --spread impact.velocity=1%";
    let (answer, files) = Answer::and_files(program, &format!("experiments {options} --out e.csv"), &given)?;
    let (said, _) = run(program, &format!("experiments {options}"), &given)?;
    let table = Table::read(files.iter().find(|(name, _)| name == "e.csv").map_or("", |(_, text)| text))?;
    let mut worst = Worst::default();
    let (shots, sets) = (answer.list("shots"), answer.list("sets"));
    holds!(shots.len() == TESTS.len() && shots.len() == table.rows.len(), "{} tests", shots.len());
    for ((shot, row), test) in shots.iter().zip(&table.rows).zip(&TESTS) {
        let solved = Answer::of(program, "solve t.toml --sensitivities", &[("t.toml", &scene_of(test))])?;
        let depth = solved.number("depth_m")?;
        let part = |(path, relative): (&str, f64)| {
            let entry = solved.list("sensitivities.parameters").iter().find(|entry| entry["path"] == path);
            relative * depth * entry.map_or(f64::NAN, |entry| of(&entry["depth"], "elasticity"))
        };
        let input = SPREADS.map(part).iter().map(|part| part * part).sum::<f64>().sqrt();
        let [predicted, measured] = ["predicted_depth_m", "measured_depth_m"].map(|name| of(shot, name));
        let (numerical, data) = (of(shot, "numerical_uncertainty_m"), of(shot, "data_uncertainty_m"));
        for (name, exact) in [
            ("velocity_m_s", test.6),
            ("measured_depth_m", test.7 / 1e3),
            ("data_uncertainty_m", test.8 / 1e3),
            ("predicted_depth_m", depth),
            ("I", solved.number("groups.I")?),
            ("N", solved.number("groups.N")?),
            ("k", solved.number("scene.k")?),
            ("input_uncertainty_m", input),
            ("ratio", predicted / measured),
            ("comparison_error_m", predicted - measured),
            ("validation_uncertainty_m", (numerical * numerical + input * input + data * data).sqrt()),
        ] {
            worst.take(apart(of(shot, name), exact), || format!("{name} of {shot} and not {exact}"));
            let cell = table.number(row, name)?;
            worst.take(apart(cell, of(shot, name)), || format!("{name} in the table, of {shot}"));
        }
        worst.take(must(shot["set"] == test.0), || format!("set of {shot}"));
        worst.take(must(numerical < 1e-14 * depth), || format!("numerical uncertainty of {shot}"));
    }
    let mut counted = 0;
    for set in sets {
        let name = set["set"].as_str().unwrap_or_default();
        // Its tests: those of its name, the shallow ones in a set beside it.
        let (of_name, is_shallow) = name.split_once(", X/d < 0.5").map_or((name, false), |(name, _)| (name, true));
        let is_of = |test: &MeasuredTest| test.0 == of_name && (test.7 < 0.5 * test.2) == is_shallow;
        let members: Vec<&Value> =
            shots.iter().zip(&TESTS).filter(|(_, test)| is_of(test)).map(|(shot, _)| shot).collect();
        // S was fitted to 13.5 to 96.7 MPa and less than 76 mm.
        let in_range = |test: &MeasuredTest| (13.5..=96.7).contains(&test.4) && test.2 < 76.0;
        let in_range = TESTS.iter().filter(|test| is_of(test) && in_range(test)).count();
        let mut ratios: Vec<f64> = members.iter().map(|shot| of(shot, "ratio")).collect();
        ratios.sort_by(f64::total_cmp);
        let count = ratios.len();
        counted += count;
        holds!(count > 0, "the set {name} has no test");
        let mean = ratios.iter().sum::<f64>() / count as f64;
        let square = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (count - 1).max(1) as f64;
        // Student's t at 95 %, by mpmath: the half width of the mean is t s/√n.
        let t =
            [f64::NAN, 12.706_204_736_174_705, 4.302_652_729_749_464, 3.182_446_305_283_709_6, 2.776_445_105_197_794_4];
        let half = t[count - 1] * square.sqrt() / (count as f64).sqrt();
        let uncertainty =
            members.iter().map(|s| (of(s, "validation_uncertainty_m") / of(s, "measured_depth_m")).powi(2));
        let uncertainty = (uncertainty.sum::<f64>() / count as f64).sqrt();
        let (least, greatest) = (ratios[0], ratios[count - 1]);
        let median = if count % 2 == 1 { ratios[count / 2] } else { 0.5 * (ratios[count / 2 - 1] + ratios[count / 2]) };
        let within = ratios.iter().filter(|ratio| (0.8..=1.2).contains(*ratio)).count();
        let numbers = [
            ("shots", count as f64),
            ("median", median),
            ("spread", if count > 1 { square.sqrt() } else { f64::NAN }),
            ("least", least),
            ("greatest", greatest),
            ("within_20_percent", within as f64),
            ("in_range_of_fit", in_range as f64),
            ("mean_comparison_error", mean - 1.0),
            ("validation_uncertainty", uncertainty),
        ];
        let within_u_val =
            members.iter().filter(|s| of(s, "comparison_error_m").abs() <= of(s, "validation_uncertainty_m")).count();
        worst.take(must(set["within_validation_uncertainty"] == within_u_val), || format!("|E| <= u_val of {name}"));
        for (index, side) in [-1.0, 1.0].into_iter().enumerate().filter(|_| count > 1) {
            let (found, exact) = (of_end(&set["mean_comparison_error95"], index), mean - 1.0 + side * half);
            worst.take((found - exact).abs(), || format!("interval of {name}: {found} and not {exact}"));
        }
        for (field, exact) in numbers.into_iter().filter(|(_, exact)| !exact.is_nan()) {
            let error = if field == "spread" { (of(set, field) - exact).abs() } else { apart(of(set, field), exact) };
            worst.take(error, || format!("{field} of {name}: {} and not {exact}", set[field]));
        }
        // The rows of the text, one in each of three tables.
        let spread = if count > 1 { format!("{:.2}", square.sqrt()) } else { "-".to_owned() };
        let outliers =
            shots.iter().zip(&TESTS).filter(|(shot, test)| is_of(test) && shot["is_outlier"] == true).count();
        let first = format!("{count} {median:.2} {spread} {least:.2} to {greatest:.2} {within} {outliers}");
        let last = if uncertainty.is_nan() { "not given".to_owned() } else { format!("{:.1} %", 100.0 * uncertainty) };
        let interval = if count > 1 {
            format!("{:+.1} to {:+.1} %", 100.0 * (mean - 1.0 - half), 100.0 * (mean - 1.0 + half))
        } else {
            "-".to_owned()
        };
        let error = format!("{:+.1} % {interval}", 100.0 * (mean - 1.0));
        let second = format!("{} {error}", set["in_range_of_fit"]);
        let third = format!("{last} {within_u_val} of {count}");
        for row in [first, second, third] {
            let row = format!("{name} {row}");
            let stands = said.out.lines().any(|line| line.split_whitespace().collect::<Vec<_>>().join(" ") == row);
            worst.take(must(stands), || format!("the text has no row `{row}`"));
        }
    }
    holds!(counted == shots.len(), "{counted} of {} tests are in a set", shots.len());
    Ok(worst.measurement())
}

fn middle_and_bar(MiddleAndBar { of: scenes }: &MiddleAndBar, subject: &Subject<'_>) -> Found {
    let program = subject.program()?;
    let mut seen = Vec::new();
    let ends = |answer: &Answer, path: &str| -> Found<[f64; 2]> {
        Ok([answer.number(&format!("{path}.0"))?, answer.number(&format!("{path}.1"))?])
    };
    // The middle of two neighbours is one of them.
    let is_middle =
        |value: f64, [low, high]: [f64; 2]| (value - (low + 0.5 * (high - low))).abs() <= (low.next_up() - low);
    let mut widths = 0;
    for scene in scenes {
        let answer = Answer::of(program, &format!("critical {scene}.toml --method enclosure"), &[])?;
        let interval = ends(&answer, "enclosure.critical_velocity_m_s")?;
        let (velocity, bar) = (answer.number("critical_velocity_m_s")?, answer.number("error_bar_m_s")?);
        let energy = 0.5 * answer.number("scene.mass_kg")? * velocity * velocity;
        widths += usize::from(interval[1] > interval[0]);
        if !is_middle(velocity, interval) || 2.0 * bar != interval[1] - interval[0] {
            seen.push(format!("V_c of {scene}: {velocity} +- {bar}, and {interval:?}"));
        }
        if apart(answer.number("critical_energy_j")?, energy) > 1e-14 {
            seen.push(format!("E_c of {scene} is not {energy}"));
        }
        let answer = Answer::of(program, &format!("solve {scene}.toml --method enclosure"), &[])?;
        for name in ["depth_m", "time_s", "velocity_m_s"] {
            let (value, interval) = (answer.number(name)?, ends(&answer, &format!("enclosure.{name}"))?);
            if !is_middle(value, interval) {
                seen.push(format!("{name} of {scene}: {value} and {interval:?}"));
            }
        }
    }
    holds!(widths > 0, "no interval has a width");
    let count = seen.len();
    Ok(crate::suite::Measurement::count(count).remark(seen.into_iter().next().unwrap_or_default()))
}

fn step_errors(StepErrors { options }: &StepErrors, subject: &Subject<'_>) -> Found {
    let (program, scene) = (subject.program()?, subject.shipped_scene()?);
    let answer = Answer::of(program, &format!("converge {scene}.toml {options}"), &[])?;
    let rules = ["velocity", "events"].map(|rule| answer.at("method")[rule].as_str().unwrap_or_default());
    let [velocity, events] = rules;
    let of_quantity = |quantity: &Value| {
        let mut worst = Worst::default();
        let name = quantity["quantity"].as_str().unwrap_or_default();
        let points: Vec<&Value> = quantity["points"].as_array().into_iter().flatten().collect();
        holds!(points.len() > 3, "{name} has {} points", points.len());
        for point in points.iter().step_by(points.len().div_ceil(3)) {
            let dt = of(point, "dt_s");
            let command = if name == "critical_velocity" { "critical" } else { "solve" };
            let rules = format!("--method central-difference --velocity {velocity} --events {events} --dt {dt:e}");
            let solved = Answer::of(program, &format!("{command} {scene}.toml {rules}"), &[])?;
            let field = if name == "critical_velocity" {
                "relative_error".to_owned()
            } else {
                format!("relative_error.{name}")
            };
            let (error, exact) = (of(point, "error"), solved.number(&field)?);
            // Both are known to round-off of the value.
            let off = (error - exact).abs() / exact.max(1e-6);
            worst.take(off, || format!("error of {name} at {dt:e} s: {error} and not {exact}"));
        }
        let used: Vec<(f64, f64)> = points
            .iter()
            .filter(|point| point["used"] == true)
            .map(|point| (of(point, "dt_s").ln(), of(point, "error").ln()))
            .collect();
        if let (Some(order), true) = (quantity["observed_order"].as_f64(), used.len() > 3) {
            let count = used.len() as f64;
            let (x, y) = (used.iter().map(|p| p.0).sum::<f64>() / count, used.iter().map(|p| p.1).sum::<f64>() / count);
            let slope = used.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
                / used.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
            worst.take((order - slope).abs(), || format!("order of {name}: {order} and not {slope}"));
            let constant = (y - slope * x).exp();
            let shown = of(quantity, "error_constant");
            worst.take(apart(shown, constant), || format!("constant of {name}: {shown} and not {constant}"));
        }
        Ok(worst)
    };
    let quantities = answer.list("quantities");
    holds!(quantities.len() > 1, "{} quantities", quantities.len());
    let mut worst = Worst::default();
    for of in quantities.par_iter().map(of_quantity).collect::<Found<Vec<_>>>()? {
        worst.take(of.value, || of.place);
    }
    Ok(worst.measurement())
}

/// A point of a figure: the figure, words on its axis, series, and both numbers.
type Drawn = (String, String, String, [f64; 2]);

/// Adds to `worst` how far each of `points` is from the nearest of `others`.
fn not_among(points: &[Drawn], others: &[Drawn], worst: &mut Worst) {
    for (figure, words, series, at) in points {
        let alike = others.iter().filter(|other| (&other.0, &other.1, &other.2) == (figure, words, series));
        let off = |other: &Drawn| apart(other.3[0], at[0]).max(apart(other.3[1], at[1]));
        let off = alike.map(off).fold(f64::INFINITY, f64::min);
        worst.take(off, || format!("{figure}, {words}, {series}: {at:?}"));
    }
}

fn bench_figures(subject: &Subject<'_>) -> Found {
    const PAGE: f64 = 4096.0;
    complete_build()?;
    let scene = subject.shipped_scene()?;
    let line = format!("bench {scene} --parts work-precision,scaling --most 10 --repeats 1 --out r");
    let (answer, files) = Answer::and_files(subject.program()?, &line, &[])?;
    let [cost, growth] = [format!("cost-{scene}"), "growth".to_owned()];
    let (mut worst, mut stated) = (Worst::default(), Vec::<Drawn>::new());
    for run in answer.list("runs").iter().filter(|run| run["state"] == "right") {
        let costs = [
            ("time of a solution [µs]", 1e-3 * of(&run["time"], "median_ns")),
            ("force evaluations of a solution", of(run, "force_evaluations")),
        ];
        let name = run["method"].as_str().unwrap_or_default();
        let points = costs.map(|(words, x)| (cost.clone(), words.to_owned(), name.to_owned(), [x, of(run, "error")]));
        stated.extend(points.into_iter().filter(|point| point.3[0] > 0.0));
    }
    for row in answer.list("growth") {
        let [scenes, seconds, threads, bytes] =
            ["scenes", "seconds", "threads", "peak_bytes"].map(|name| of(row, name));
        let (time, series) =
            (1e6 * seconds / scenes, format!("{threads} thread{}", if threads > 1.0 { "s" } else { "" }));
        worst.take(apart(of(row, "ns_a_scene"), 1e3 * time), || format!("time of one of {scenes} scenes"));
        stated.push((growth.clone(), "time for each scene [µs]".to_owned(), series.clone(), [scenes, time]));
        // No system need count the memory; one that does counts pages.
        if bytes.is_finite() {
            worst.take(must(bytes % PAGE == 0.0), || format!("{bytes} bytes"));
            stated.push((growth.clone(), "peak memory [MB]".to_owned(), series, [scenes, 1e-6 * bytes]));
        }
    }
    holds!(stated.len() > 100, "{} points", stated.len());
    let mut drawn = Vec::<Drawn>::new();
    for (figure, axis) in [(cost, "x_axis"), (growth, "y_axis")] {
        let path = format!("r/tables/{figure}.csv");
        let file = files.iter().find(|(name, _)| *name == path);
        let table = Table::read(&file.ok_or_else(|| NotMeasured::broken(format!("no {path}")))?.1)?;
        for row in &table.rows {
            let [words, series] = [table.cell(row, axis)?, table.cell(row, "series")?].map(str::to_owned);
            drawn.push((figure.clone(), words, series, [table.number(row, "x")?, table.number(row, "y")?]));
        }
    }
    not_among(&stated, &drawn, &mut worst);
    not_among(&drawn, &stated, &mut worst);
    // Whatever of the memory was seen.
    Ok(worst.measurement().cases(answer.list("runs").len() + answer.list("growth").len()))
}

fn bench_levels(subject: &Subject<'_>) -> Found {
    complete_build()?;
    let line = format!("bench {} --parts work-precision --repeats 1 --out r", subject.shipped_scene()?);
    let (said, files) = run(subject.program()?, &line, &[])?;
    let report = files.into_iter().find(|(path, _)| path == "r/report.json").unwrap_or_default().1;
    let answer = Answer::read(&line, &Said { out: report, ..said.clone() })?;
    let (mut worst, mut rows) = (Worst::default(), 0);
    let mut levels: Vec<f64> = Vec::new();
    for row in said.out.lines() {
        let words: Vec<&str> = row.split_whitespace().collect();
        let [name, cells @ .., least] = &words[..] else { continue };
        if *name == "method" {
            levels = cells.iter().map(|level| level.parse()).collect::<Result<_, _>>()?;
        }
        let is_right = |run: &&Value| run["method"] == *name && run["state"] == "right";
        let runs: Vec<&Value> = answer.list("runs").iter().filter(is_right).collect();
        if runs.is_empty() {
            continue;
        }
        rows += 1;
        let exact = runs.iter().map(|run| of(run, "error")).fold(f64::INFINITY, f64::min);
        worst.take(apart(least.parse()?, exact), || format!("{name}: least {least} and not {exact}"));
        let mut cells = cells.iter();
        for level in &levels {
            // A time and its setting, or a stroke where no setting reaches the level.
            let setting = cells.next().filter(|word| **word != "-").and_then(|_| cells.next());
            let holds = match setting {
                Some(setting) => runs.iter().any(|run| run["setting"] == **setting && of(run, "error") <= *level),
                None => exact > *level,
            };
            worst.take(must(holds), || format!("{name} at {level}: {setting:?}, least {exact}"));
        }
    }
    holds!(rows > 8, "{rows} methods in the text");
    Ok(worst.measurement())
}

fn three_grid_rule(ThreeGridRule { steps, values }: &ThreeGridRule, subject: &Subject<'_>) -> Found {
    let row = |(step, value): (&f64, &f64)| format!("{step:?},{value:?}\n");
    let rows = steps.iter().zip(values).map(row).collect::<Vec<_>>().concat();
    let table = format!("dt_s,f\n{rows}");
    let answer = Answer::of(subject.program()?, "audit r.csv", &[("r.csv", &table)])?;
    let [h1, h2, h3] = *steps;
    let [f1, f2, f3] = *values;
    let (r21, r32, e21, e32) = (h2 / h1, h3 / h2, f2 - f1, f3 - f2);
    let sign = (e32 / e21).signum();
    // The fixed point of the procedure, damped: p = |ln|e32/e21| + q(p)| / ln r21.
    let mut order = 1.0;
    for _ in 0..10_000 {
        let q = ((r21.powf(order) - sign) / (r32.powf(order) - sign)).ln();
        order = 0.5 * (order + ((e32 / e21).abs().ln() + q).abs() / r21.ln());
    }
    let factor = r21.powf(order) - 1.0;
    let (approximate, index) = (e21.abs() / f1.abs(), 1.25 * (e21 / f1).abs() / factor);
    let mut worst = Worst::default();
    for (name, exact) in [
        ("order", order),
        ("approximate_error", approximate),
        ("extrapolated", (r21.powf(order) * f1 - f2) / factor),
        ("grid_convergence_index", index),
        ("ratios.0", r21),
        ("ratios.1", r32),
        ("uncertainty.half_width", index * f1.abs()),
        ("values.0", f1),
        ("values.2", f3),
        ("steps.0", h1),
        ("steps.2", h3),
    ] {
        let value = answer.number(&format!("quantities.0.three_grids.{name}"))?;
        worst.take(apart(value, exact), || format!("{name}: {value} and not {exact}"));
    }
    Ok(worst.measurement())
}
