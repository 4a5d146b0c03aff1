//! Are numbers what they are defined to be, however they come in or are summed up? Each definition is written again here.

use std::sync::Arc;

use super::super::claim::Found;
use super::Subject;
use super::edges::Violations;
use crate::exchange::tables::{At, Cells, Kind, Layout, Rows};
use crate::physics::expression::{Known, Tape, Unit};
use crate::physics::units::{Dimension, quantity};
use crate::studies::batch::SCENES;
use crate::studies::bench::Timing;
use crate::studies::diagnosis::{LADDER, Limit};
use crate::studies::random::Random;

check! {
    /// Random expressions with powers of every kind: derivatives by x and by V that are not the limit of their differences.
    Gradients {
        /// How many expressions.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        expressions: usize,
    } in Input, "violations", counting gradients, compares nothing;

    /// Random expressions that put unlike units together, or take a function of one: those that are read, and those with like
    /// units that are refused.
    UnlikeUnits {
        /// How many of each.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        expressions: usize,
    } in Input, "violations", counting unlike_units, compares nothing;

    /// Tables of scenes in memory, each column in a random unit: numbers that are not those that the same digits with that
    /// unit are in a scene file, and rows that do not have their number.
    TablesInMemory {
        /// How many tables.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        tables: usize,
    } in Input, "violations", counting tables_in_memory, compares nothing;

    /// Quartiles of random times: samples below and above them that are not a quarter and a half, and shares of a time that
    /// are not in proportion.
    Quartiles {
        /// How many samplings.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        samplings: usize,
    } in Commands, "violations", counting quartiles, compares nothing;

    /// Limits of small steps by `diagnose`, of random errors `L + h (C + D h + noise)`: shares of them beyond quantiles of
    /// Student's t that are not the shares of these.
    LimitsOfLadders {
        /// How many ladders of steps.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        ladders: usize,
    } in Commands, "violations", counting limits_of_ladders, compares nothing;
}

/// A sum of products of powers of x and V.
fn sum_of_powers(random: &mut Random) -> String {
    const EXPONENTS: [&str; 9] = ["0.5", "1.5", "2.5", "3.5", "2", "3", "0.7", "-1.5", "1"];
    let mut factor = |of: &str| {
        let exponent = EXPONENTS[random.below(EXPONENTS.len())];
        let shift = random.uniform(0.2, 2.0);
        match random.below(6) {
            0 => format!("({of})^({exponent})"),
            1 => format!("({of} + {shift:.3})^({exponent})"),
            2 => format!("sqrt({of} + {shift:.3})"),
            3 => format!("exp(-{shift:.3}*{of})"),
            4 => format!("({shift:.3} + ({of})^2)^({exponent})"),
            _ => format!("log(1 + {of})/({shift:.3} + {of})"),
        }
    };
    (0..3).map(|_| format!("{}*{}", factor("x/a"), factor("V/b"))).collect::<Vec<_>>().join(" + ")
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn gradients(&Gradients { expressions }: &Gradients, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    // Differences of the fourth order: the truncation is 1e-12 of what the powers above make of it.
    const STEP: f64 = 1e-3;
    let mut random = subject.random("gradients");
    let known = [("a", Dimension::Length), ("b", Dimension::Velocity)];
    let known = known.map(|(name, unit)| Known { name, value: 1.0, unit: unit.into() });
    for _ in 0..expressions {
        let text = sum_of_powers(&mut random);
        let Ok(tape) = Tape::read(&text, &known, Unit::NONE) else {
            seen.expect(false, || format!("`{text}` is refused"));
            continue;
        };
        let bound = tape.bind(tape.parameters());
        let (x, v) = (random.uniform(0.3, 2.0), random.uniform(0.3, 2.0));
        let (_, by_x, by_v) = bound.gradient(x, v);
        let difference = |f: &dyn Fn(f64) -> f64, at: f64| {
            let h = STEP * at;
            (8.0 * (f(at + h) - f(at - h)) - (f(at + 2.0 * h) - f(at - 2.0 * h))) / (12.0 * h)
        };
        let [d_x, d_v] = [difference(&|x| bound.eval(x, v), x), difference(&|v| bound.eval(x, v), v)];
        let size = bound.eval(x, v).abs() + d_x.abs() * x + d_v.abs() * v;
        for (found, exact, at, name) in [(by_x, d_x, x, "x"), (by_v, d_v, v, "V")] {
            let holds = (found - exact).abs() * at <= 1e-6 * size;
            seen.expect(holds, || format!("d/d{name} of `{text}` at {x}, {v}: {found}, by differences {exact}"));
        }
    }
    Ok(())
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn unlike_units(&UnlikeUnits { expressions }: &UnlikeUnits, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    const DIMENSIONS: [Dimension; 6] = [
        Dimension::Length,
        Dimension::Velocity,
        Dimension::Time,
        Dimension::Force,
        Dimension::Pressure,
        Dimension::Mass,
    ];
    const FUNCTIONS: [&str; 8] = ["exp", "log", "log10", "tanh", "sin", "cos", "atan", "2^"];
    let mut random = subject.random("unlike-units");
    for _ in 0..expressions {
        let first = random.below(DIMENSIONS.len());
        let second = (first + 1 + random.below(DIMENSIONS.len() - 1)) % DIMENSIONS.len();
        let known = [("a", first), ("b", second), ("c", first)];
        let known = known.map(|(name, dimension)| Known { name, value: 2.0, unit: Unit::from(DIMENSIONS[dimension]) });
        let (like, unlike) = match random.below(5) {
            0 => ("(a + c)/a".to_owned(), "(a + b)/a".to_owned()),
            1 => ("(a - c)/a".to_owned(), "(b - c)/b".to_owned()),
            2 => ("min(a, c)/a".to_owned(), "min(a, b)/a".to_owned()),
            3 => ("max(c, a)/c".to_owned(), "max(b, c)/b".to_owned()),
            _ => {
                let of = FUNCTIONS[random.below(FUNCTIONS.len())];
                (format!("{of}(a/c)"), format!("{of}(a/b)"))
            }
        };
        let is_read = |text: &str| Tape::read(text, &known, Unit::NONE).is_ok();
        seen.expect(is_read(&like), || format!("`{like}` is refused"));
        seen.expect(!is_read(&unlike), || format!("`{unlike}` is read, of {:?}", known.map(|known| known.unit)));
    }
    Ok(())
}

fn tables_in_memory(
    &TablesInMemory { tables }: &TablesInMemory,
    subject: &Subject<'_>,
    seen: &mut Violations,
) -> Found<()> {
    const ROWS: u64 = 3;
    let mut random = subject.random("tables-in-memory");
    for table in 0..tables {
        let first = 1 + random.below(1_000_000) as u64;
        let (mut names, mut columns, mut units) = (Vec::new(), Vec::new(), Vec::new());
        for column in SCENES.columns {
            let (name, unit) = match column.measure {
                Some((stem, dimension)) => {
                    let unit = dimension.units()[random.below(dimension.units().len())];
                    (format!("{stem} ({unit})"), Some((unit, dimension)))
                }
                None => (column.name.to_owned(), None),
            };
            names.push(name);
            units.push(unit);
            columns.push(match column.kind {
                Kind::Number => {
                    Cells::Numbers((0..ROWS).map(|_| Some(f64::from(1 + random.below(8) as u32) / 8.0)).collect())
                }
                kind => Cells::empty(kind),
            });
        }
        let words: Vec<&str> = names.iter().map(String::as_str).collect();
        let layout = match Layout::new(&words, "memory", At::Table, &SCENES) {
            Ok(layout) => Arc::new(layout),
            Err(error) => {
                seen.expect(false, || format!("table {table}: {error}"));
                continue;
            }
        };
        let given: Vec<Option<Vec<Option<f64>>>> = columns
            .iter()
            .map(|cells| match cells {
                Cells::Numbers(numbers) => Some(numbers.clone()),
                _ => None,
            })
            .collect();
        let rows = Rows::of_columns(&layout, columns, first);
        for index in 0..ROWS as usize {
            let is_numbered = rows.at(index) == At::Row(first + index as u64);
            seen.expect(is_numbered, || format!("row {index} of table {table} is not row {}", first + index as u64));
            let row = rows.row(index)?;
            for (column, numbers) in given.iter().enumerate() {
                let Some(Some(number)) = numbers.as_ref().map(|numbers| numbers[index]) else { continue };
                // An angle or a share may be out of range, and is then refused.
                let Ok(found) = row.optional(column) else { continue };
                let exact = match units[column] {
                    Some((unit, dimension)) => quantity(&format!("{number} {unit}"), dimension)?,
                    None => number,
                };
                let holds = found.is_some_and(|found| (found / exact - 1.0).abs() < 1e-14);
                seen.expect(holds, || format!("{number} in `{}` is {found:?} and not {exact}", names[column]));
            }
        }
    }
    Ok(())
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn quartiles(&Quartiles { samplings }: &Quartiles, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let mut random = subject.random("quartiles");
    for _ in 0..samplings {
        // With 4 k + 1 samples each quartile is one of them.
        let quarter = 1 + random.below(6);
        let samples: Vec<f64> = (0..=4 * quarter).map(|_| random.log_uniform(1.0, 1e6)).collect();
        let parts = 1 + random.below(1000);
        let Some(timing) = Timing::of(samples.clone()) else {
            seen.expect(false, || "samples without a time".to_owned());
            continue;
        };
        let below = |at: f64| samples.iter().filter(|sample| **sample < at).count();
        for (name, at, count) in [
            ("low", timing.low_ns, quarter),
            ("median", timing.median_ns, 2 * quarter),
            ("high", timing.high_ns, 3 * quarter),
        ] {
            let is_one = samples.contains(&at);
            seen.expect(is_one && below(at) == count, || format!("{} of {} below {name}", below(at), samples.len()));
        }
        seen.expect(timing.samples == samples.len(), || format!("{} samples", timing.samples));
        let share = timing.over(parts);
        for (whole, part) in
            [(timing.low_ns, share.low_ns), (timing.median_ns, share.median_ns), (timing.high_ns, share.high_ns)]
        {
            seen.expect((part * parts as f64 / whole - 1.0).abs() < 1e-12, || format!("{part} of {whole} in {parts}"));
        }
    }
    Ok(())
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn limits_of_ladders(
    &LimitsOfLadders { ladders }: &LimitsOfLadders,
    subject: &Subject<'_>,
    seen: &mut Violations,
) -> Found<()> {
    // Quantiles of Student's t with as many degrees of freedom as a ladder leaves: 8 steps, 3 unknowns.
    const BEYOND: [(f64, f64); 2] = [(0.5, 0.7267), (0.05, 2.5706)];
    let mut random = subject.random("limits-of-ladders");
    let mut beyond = [0_u32; BEYOND.len()];
    for _ in 0..ladders {
        let [limit, c, d] = [random.uniform(-1.0, 1.0), random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0)];
        let (scale, noise) = (random.log_uniform(1e-9, 1e-3), random.log_uniform(1e-3, 10.0));
        let points = LADDER.map(|h| {
            // A sum of twelve shares is normal but in its far tails.
            let normal = (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
            (scale * h, limit + h * (c + d * h + noise * normal))
        });
        let found = Limit::of(&points).map(|found| ((found.error - limit) / found.standard_error).abs());
        seen.expect(found.is_some_and(f64::is_finite), || format!("no limit of {points:?}"));
        for ((_, quantile), count) in BEYOND.iter().zip(&mut beyond) {
            *count += u32::from(found.is_some_and(|found| found > *quantile));
        }
    }
    for ((share, quantile), count) in BEYOND.into_iter().zip(beyond) {
        let count = f64::from(count);
        let expected = share * ladders as f64;
        // One seed in a million lies outside of five standard deviations, which leaves room for the tails above.
        let holds = (count - expected).abs() <= 5.0 * (expected * (1.0 - share)).sqrt();
        seen.expect(holds, || format!("{count} of {ladders} limits beyond {quantile} standard errors, not {expected}"));
    }
    Ok(())
}
