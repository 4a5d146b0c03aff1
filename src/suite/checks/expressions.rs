//! Do expressions mean what is proved of them?

use super::super::claim::Found;
use super::Subject;
use super::edges::Violations;
use crate::physics::expression::{Known, Tape, Unit};
use crate::physics::units::Dimension;
use crate::studies::random::Random;

check! {
    /// Random expressions over random boxes of x and V: values that lie outside of the range that is stated of the box. Where
    /// an event may hide follows from such ranges.
    Ranges {
        /// How many expressions.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        expressions: usize,
    } in Input, "violations", counting ranges, compares nothing;
}

/// An expression of plain numbers, `depth` operations deep.
fn text(random: &mut Random, depth: u32) -> String {
    if depth == 0 {
        let number = format!("{:.3}", random.uniform(-2.0, 2.0));
        return ["(x/a)", "(V/b)", "(x/a - 0.7)", "(V/b - 0.4)", &format!("({number})")][random.below(5)].to_owned();
    }
    let mut next = || text(random, depth - 1);
    let (one, other) = (next(), next());
    match random.below(14) {
        0 => format!("({one} + {other})"),
        1 => format!("({one} - {other})"),
        2 => format!("({one}*{other})"),
        3 => format!("({one}/{other})"),
        4 => format!("{one}^2"),
        5 => format!("{one}^3"),
        6 => format!("{one}^4"),
        7 => format!("sqrt(abs({one}))"),
        8 => format!("abs({one})^1.5"),
        9 => format!("exp({one})"),
        10 => format!("sin({one})*cos({other})"),
        11 => format!("tanh({one}) + atan({other})"),
        12 => format!("min({one}, {other})"),
        _ => format!("log(1 + abs({one})) - max({one}, {other})"),
    }
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn ranges(&Ranges { expressions }: &Ranges, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    const POINTS: u32 = 8;
    let mut random = subject.random("ranges");
    let known = [("a", Dimension::Length), ("b", Dimension::Velocity)];
    let known = known.map(|(name, unit)| Known { name, value: 1.0, unit: unit.into() });
    for index in 0..expressions {
        let text = text(&mut random, 1 + (index % 3) as u32);
        let Ok(tape) = Tape::read(&text, &known, Unit::NONE) else {
            seen.expect(false, || format!("`{text}` is refused"));
            continue;
        };
        let bound = tape.bind(tape.parameters());
        let side = |random: &mut Random| {
            let from = random.uniform(0.0, 2.0);
            (from, from + random.log_uniform(1e-3, 3.0))
        };
        let (x, v) = (side(&mut random), side(&mut random));
        let (low, high) = bound.range(x, v);
        let at = |(from, to): (f64, f64), part: u32| from + (to - from) * f64::from(part) / f64::from(POINTS);
        for (i, j) in (0..=POINTS).flat_map(|i| (0..=POINTS).map(move |j| (i, j))) {
            let value = bound.eval(at(x, i), at(v, j));
            let room = 1e-12 * value.abs().max(1.0);
            let holds = !value.is_finite() || (low - room..=high + room).contains(&value);
            let place = || format!("`{text}` is {value} at x = {}, V = {}, not {low} to {high}", at(x, i), at(v, j));
            seen.expect(holds, place);
        }
    }
    Ok(())
}
