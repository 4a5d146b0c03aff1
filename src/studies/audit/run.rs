//! The end of a run of another code, from the history that it prints: depth, time and velocity for one row of a table.
//!
//! Three layouts are read, each known by its own lines:
//!
//! - an X-Y report of Abaqus/CAE (Report > XY, one table; `session.writeXYReport`): a line of names that begins with `X`,
//!   and lines of numbers below it; X is the time, `NoValue` an absent number;
//! - `rbdout` of LS-DYNA (\*DATABASE_RBDOUT): `r i g i d   b o d y   m o t i o n   a t`, and for each rigid body global
//!   `displacements:` and `velocities:`;
//! - `nodout` of LS-DYNA (\*DATABASE_NODOUT): `n o d a l   p r i n t   o u t`, and a line a node.
//!
//! The layouts of LS-DYNA are those of its program `l2a`, which writes these files from a binary one.
//!
//! # End of a run
//! Depth is the displacement along the axis, in the direction of the first velocity. The run ends where the depth first
//! reaches the thickness, if there is one, else where the velocity first is zero. Inside the interval between two lines
//! V runs linearly, and x along the cubic with the depths and velocities of both. Half-units of the last digits pass
//! over to the end: a time inherits those of the depth over the velocity.

use thiserror::Error;

use super::table::{half_last_digit, parse};
use crate::physics::{Advice, State};
use crate::text::shortened;

/// Axes of a displacement and a velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Axis {
    /// x, 1.
    X,
    /// y, 2.
    Y,
    /// z, 3.
    Z,
}

/// How histories are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Axis of the flight; `None` for that of the largest velocity in the first line.
    pub axis: Option<Axis>,
    /// Number of the node or rigid body; `None` for the only one.
    pub id: Option<u64>,
    /// One unit of length in the files (m).
    pub length: f64,
    /// One unit of time in the files (s).
    pub time: f64,
    /// Depth at which a run has left the target (m); infinite for none.
    pub thickness: f64,
}

/// A run of another code.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Its file, as in messages.
    pub file: String,
    /// Its step (s).
    pub step: f64,
    /// What the file holds.
    pub text: String,
}

/// Why a history gives no row.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RunError {
    /// No line of the three layouts.
    #[error("no X-Y report of Abaqus, and no rbdout or nodout of LS-DYNA")]
    UnknownLayout,
    /// A line that does not hold what its place demands.
    #[error("line {line}: {what}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// The body asked for is not there, or there are several and none is asked for.
    #[error("{0}")]
    Bodies(String),
    /// The history stops before the end of the flight.
    #[error("the run does not come to its end: {0}")]
    NoEnd(String),
    /// Another end than that of the first run.
    #[error("the run {}, and that of {other} {}", outcome(*.is_exit), outcome(!.is_exit))]
    Outcome {
        /// Whether this one leaves the target.
        is_exit: bool,
        /// File of the first run.
        other: String,
    },
    /// Displacement and velocity cannot be found by the names of their columns.
    #[error("{0}")]
    Columns(String),
}

impl Advice for RunError {
    fn help(&self) -> String {
        match self {
            Self::UnknownLayout => "name a file of one of these layouts, or make a table with dt_s and the results",
            Self::Line { .. } => "correct the line, or write the file again",
            Self::Bodies(_) => "choose one with --id",
            Self::NoEnd(_) => "run longer, or give the thickness with --scene or --thickness",
            Self::Outcome { .. } => "leave out the runs with another outcome: their results have no common limit",
            Self::Columns(_) => "name the curves by their variable, such as U3 and V3, and write them as one table",
        }
        .to_owned()
    }
}

fn outcome(is_exit: bool) -> &'static str {
    if is_exit { "leaves the target" } else { "comes to rest" }
}

/// A number with half a unit of its last digit.
pub(super) type Rounded = (f64, f64);

/// What a history says of one moment, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Moment {
    time: Rounded,
    displacement: [Option<Rounded>; 3],
    velocity: [Option<Rounded>; 3],
}

/// The end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct End {
    /// Whether it lies at the thickness, and not at rest.
    pub(super) is_exit: bool,
    pub(super) state: State,
    /// Half-widths of the rounding of depth, time and velocity.
    pub(super) rounding: [f64; 3],
}

fn at_line(index: usize, what: impl Into<String>) -> RunError {
    RunError::Line { line: index + 1, what: what.into() }
}

fn number(text: &str) -> Option<Rounded> {
    Some((parse(text)?, half_last_digit(text)))
}

/// The numbers in `text`, which is of line `index`.
fn numbers(text: &str, index: usize) -> Result<Vec<Rounded>, RunError> {
    let bad = |text: &str| at_line(index, format!("`{}` is not a number", shortened(text)));
    text.split_whitespace().map(|word| number(word).ok_or_else(|| bad(word))).collect()
}

/// The first three of `all`, which has at least as many.
fn components(all: &[Rounded], index: usize) -> Result<[Option<Rounded>; 3], RunError> {
    match all {
        [x, y, z, ..] => Ok([Some(*x), Some(*y), Some(*z)]),
        _ => Err(at_line(index, "three components are missing")),
    }
}

/// The end of the flight that the history `text` tells, as `reading` says.
pub(super) fn end_of(text: &str, reading: &Reading) -> Result<End, RunError> {
    let moments = if text.contains("r i g i d   b o d y   m o t i o n") {
        rbdout(text, reading.id)?
    } else if text.contains("n o d a l   p r i n t   o u t") {
        nodout(text, reading.id)?
    } else {
        report(text)?
    };
    end(&moments, reading)
}

/// A body among those of a file: the one asked for, or the only one.
struct Body {
    wanted: Option<u64>,
    seen: Option<u64>,
}

impl Body {
    /// Whether body `id` is the one.
    fn is(&mut self, id: u64) -> Result<bool, RunError> {
        if let Some(wanted) = self.wanted {
            return Ok(id == wanted);
        }
        match self.seen.replace(id) {
            Some(before) if before != id => {
                Err(RunError::Bodies(format!("there are several bodies, {before} and {id}")))
            }
            _ => Ok(true),
        }
    }

    fn missing(&self) -> RunError {
        RunError::Bodies(
            self.wanted.map_or_else(|| "there is no body".to_owned(), |id| format!("there is no body {id}")),
        )
    }
}

/// The last whole number of a line.
fn id_of(line: &str, index: usize) -> Result<u64, RunError> {
    let id = line.split_whitespace().next_back().and_then(|word| word.parse().ok());
    id.ok_or_else(|| at_line(index, "the number of the body is missing"))
}

fn rbdout(text: &str, id: Option<u64>) -> Result<Vec<Moment>, RunError> {
    let mut body = Body { wanted: id, seen: None };
    let mut moments = Vec::new();
    // Time of the state; whether the body follows; its displacements, once they are read.
    let (mut time, mut is_body, mut displacement) = (None, false, None);
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.contains("r i g i d   b o d y   m o t i o n") {
            let text = line.rsplit_once("time=").map(|(_, text)| text.trim());
            time = Some(text.and_then(number).ok_or_else(|| at_line(index, "the time is missing"))?);
            is_body = false;
        } else if line.starts_with("rigid body") || line.starts_with("nodal rigid body") {
            (is_body, displacement) = (body.is(id_of(line, index)?)?, None);
        } else if let (true, Some(rest)) = (is_body, line.strip_prefix("displacements:")) {
            displacement = Some(components(&numbers(rest, index)?, index)?);
        } else if let (true, Some(rest)) = (is_body, line.strip_prefix("velocities:")) {
            let velocity = components(&numbers(rest, index)?, index)?;
            let (Some(time), Some(displacement)) = (time, displacement) else {
                return Err(at_line(index, "velocities come before a time and displacements"));
            };
            moments.push(Moment { time, displacement, velocity });
            // The same follows in the coordinates of the body.
            is_body = false;
        }
    }
    if moments.is_empty() { Err(body.missing()) } else { Ok(moments) }
}

/// Numbers of a line of `nodout`, and the width of each.
const NODE_NUMBERS: usize = 12;

fn nodout(text: &str, id: Option<u64>) -> Result<Vec<Moment>, RunError> {
    let mut body = Body { wanted: id, seen: None };
    let mut moments = Vec::new();
    // A file may hold rotations as well, in states of their own.
    let (mut time, mut is_translation) = (None, false);
    for (index, line) in text.lines().enumerate() {
        if line.contains("n o d a l   p r i n t   o u t") {
            let text = line.rsplit_once("at time").map(|(_, text)| text.trim().trim_end_matches(')').trim());
            time = Some(text.and_then(number).ok_or_else(|| at_line(index, "the time is missing"))?);
            is_translation = false;
        } else if line.trim_start().starts_with("nodal point") {
            is_translation = line.contains("x-disp");
        } else if let (true, Some(time), false) = (is_translation, time, line.trim().is_empty()) {
            // Twelve numbers of twelve characters, which may leave no blank between them.
            let line = line.trim_end();
            let start = line.len().checked_sub(NODE_NUMBERS * 12).filter(|&start| line.is_char_boundary(start));
            let start = start.ok_or_else(|| at_line(index, "twelve numbers of a node are missing"))?;
            let (node, rest) = line.split_at(start);
            if !body.is(id_of(node, index)?)? {
                continue;
            }
            let field = |field: usize| rest.get(12 * field..12 * field + 12).and_then(|text| number(text.trim()));
            let all: Option<Vec<Rounded>> = (0..6).map(field).collect();
            let all = all.ok_or_else(|| at_line(index, "a field of 12 characters is not a number"))?;
            let (displacement, velocity) = (components(&all[..3], index)?, components(&all[3..], index)?);
            moments.push(Moment { time, displacement, velocity });
        }
    }
    if moments.is_empty() { Err(body.missing()) } else { Ok(moments) }
}

/// The component that a name means, 0 to 2: that of `U3`, `U:U3 PI: RIGID-1 N: 1` or `disp_U3` for the letter U.
fn component(name: &str, letter: char) -> Option<usize> {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    let mut found = words.filter_map(|word| match word.strip_prefix(letter) {
        Some("1") => Some(0),
        Some("2") => Some(1),
        Some("3") => Some(2),
        _ => None,
    });
    found.next()
}

fn report(text: &str) -> Result<Vec<Moment>, RunError> {
    let mut moments: Vec<Moment> = Vec::new();
    // Names of the columns behind X.
    let mut names: Option<Vec<&str>> = None;
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let is_absent = |word: &&str| word.eq_ignore_ascii_case("novalue");
        let is_row = !words.is_empty() && words.iter().all(|word| is_absent(word) || number(word).is_some());
        if words.first() == Some(&"X") && words.len() > 1 {
            if names.is_some() {
                return Err(RunError::Columns(format!("line {}: a second table begins", index + 1)));
            }
            names = Some(words[1..].to_vec());
        } else if let (true, Some(names)) = (is_row, &names) {
            if words.len() != names.len() + 1 {
                let what =
                    format!("{} numbers under {} names: a name must have no blank in it", words.len(), names.len() + 1);
                return Err(at_line(index, what));
            }
            let column = |letter: char, axis: usize| {
                let place = names.iter().position(|name| component(name, letter) == Some(axis))?;
                number(words[place + 1])
            };
            let all = |letter: char| [0, 1, 2].map(|axis| column(letter, axis));
            let time = number(words[0]).ok_or_else(|| at_line(index, "the time is missing"))?;
            let moment = Moment { time, displacement: all('U'), velocity: all('V') };
            // Curves that are not sampled at the same times leave gaps.
            if moment.displacement.iter().zip(&moment.velocity).any(|(u, v)| u.is_some() && v.is_some()) {
                moments.push(moment);
            }
        }
    }
    match names {
        None => Err(RunError::UnknownLayout),
        Some(_) if moments.is_empty() => {
            Err(RunError::Columns("no two columns are a displacement and a velocity of one axis".to_owned()))
        }
        Some(_) => Ok(moments),
    }
}

/// One line of a history along the axis: time, depth and velocity, each with its rounding.
type Along = [Rounded; 3];

fn end(moments: &[Moment], reading: &Reading) -> Result<End, RunError> {
    let speed =
        |moment: &Moment, axis: usize| moment.displacement[axis].and(moment.velocity[axis]).map_or(-1.0, |v| v.0.abs());
    let first = &moments[0];
    let axis = reading.axis.map_or_else(
        || [0, 1, 2].into_iter().max_by(|&a, &b| speed(first, a).total_cmp(&speed(first, b))).unwrap_or(0),
        |axis| axis as usize,
    );
    let sign = if first.velocity[axis].is_some_and(|(v, _)| v < 0.0) { -1.0 } else { 1.0 };
    let units = [reading.time, sign * reading.length, sign * reading.length / reading.time];
    let along = |moment: &Moment| -> Option<Along> {
        let numbers = [moment.time, moment.displacement[axis]?, moment.velocity[axis]?];
        Some([0, 1, 2].map(|i| (numbers[i].0 * units[i], numbers[i].1 * units[i].abs())))
    };
    let mut before: Option<Along> = None;
    for now in moments.iter().filter_map(along) {
        let has_ended = now[1].0 >= reading.thickness || now[2].0 <= 0.0;
        let is_number = now.iter().all(|(number, _)| number.is_finite());
        match before {
            _ if !is_number => return Ok(undefined(&now)),
            Some(before) if now[0].0 <= before[0].0 => {
                return Err(RunError::NoEnd(format!("the time {} s comes behind {} s", now[0].0, before[0].0)));
            }
            Some(before) if has_ended => return Ok(between(&before, &now, reading.thickness)),
            None if has_ended => return Err(RunError::NoEnd("it begins at rest, or behind the target".to_owned())),
            _ => before = Some(now),
        }
    }
    let [(time, _), (depth, _), (velocity, _)] = before
        .ok_or_else(|| RunError::Columns("no line has a displacement and a velocity along the axis".to_owned()))?;
    Err(RunError::NoEnd(format!("{velocity} m/s at {depth} m after {time} s")))
}

/// A run whose numbers are none has no end.
fn undefined(now: &Along) -> End {
    let state = State { time: now[0].0, depth: f64::NAN, velocity: f64::NAN };
    End { is_exit: false, state, rounding: [0.0; 3] }
}

/// The end between two lines, the later of which is past it.
fn between(from: &Along, to: &Along, thickness: f64) -> End {
    let [(t0, _), (x0, _), (v0, _)] = *from;
    let [(t1, dt), (x1, dx), (v1, dv)] = *to;
    let size = t1 - t0;
    // The cubic with both depths and velocities, at a share of the interval.
    let depth = |share: f64| {
        let rest = 1.0 - share;
        let chord = x1 - x0;
        x0 + share * (chord + rest * (rest * (size * v0 - chord) - share * (size * v1 - chord)))
    };
    let slope = ((v0 - v1) / size).abs();
    let rest = if v1 <= 0.0 { Some(v0 / (v0 - v1)) } else { None };
    let last = rest.unwrap_or(1.0);
    let at_last = if rest.is_none() { x1 } else { depth(last) };
    if at_last < thickness {
        let share = last;
        let time = t0 + share * size;
        let rounding = [dx, if slope > 0.0 { dt + dv / slope } else { dt }, 0.0];
        return End { is_exit: false, state: State { time, depth: depth(share), velocity: 0.0 }, rounding };
    }
    let (mut low, mut high) = (0.0, last);
    // Each turn halves the interval: its ends are neighbours before the last one.
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if depth(middle) >= thickness { high = middle } else { low = middle }
    }
    let velocity = v0 + high * (v1 - v0);
    let late = if velocity > 0.0 { dx / velocity } else { 0.0 };
    let state = State { time: t0 + high * size, depth: thickness, velocity };
    End { is_exit: true, state, rounding: [0.0, dt + late, dv + slope * late] }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use super::*;

    const READING: Reading = Reading { axis: None, id: None, length: 1.0, time: 1.0, thickness: f64::INFINITY };

    /// A report of a flight with constant deceleration 2: x = 3 t - t², at rest at t = 1.5, x = 2.25.
    fn report(times: &[f64], sign: f64) -> String {
        let line = |t: &f64| format!("{t:20} {:20} {:20}\n", sign * (3.0 - t) * t, sign * (3.0 - 2.0 * t));
        let lines: String = times.iter().map(line).collect();
        format!("\n   X   U:U2   V:V2  \n\n{lines}\n")
    }

    #[test]
    fn a_run_ends_at_the_thickness_before_rest_and_at_rest_else() {
        let text = report(&[0.0, 0.7, 1.2, 2.1], -1.0);
        let rest = end_of(&text, &READING).unwrap();
        assert!(!rest.is_exit);
        let exit = end_of(&text, &Reading { thickness: 2.0, ..READING }).unwrap();
        // Between the last two lines the depth comes to 2.2 on the way to rest.
        let late = end_of(&text, &Reading { thickness: 2.2, ..READING }).unwrap();
        assert!(exit.is_exit && late.is_exit);
        // A line of V and a cubic hold a parabola exactly.
        let root = 0.05_f64.sqrt();
        for (end, expected) in
            [(rest, [2.25, 1.5, 0.0]), (exit, [2.0, 1.0, 1.0]), (late, [2.2, 1.5 - root, 2.0 * root])]
        {
            let State { depth, time, velocity } = end.state;
            for (found, expected) in [depth, time, velocity].into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{found} {expected}");
            }
        }
    }

    #[test]
    fn rounding_of_the_lines_carries_over_to_the_end() {
        let text = "X U1 V1\n1.00 1.0000 2.00\n2.00 3.0000 2.00\n";
        let End { state, rounding, .. } = end_of(text, &Reading { thickness: 2.0, ..READING }).unwrap();
        assert_eq!((state.time, state.velocity), (1.5, 2.0));
        for (found, expected) in rounding.into_iter().zip([0.0, 0.005 + 0.000_05 / 2.0, 0.005]) {
            assert!((found - expected).abs() < 1e-15, "{rounding:?}");
        }
    }

    #[test]
    fn files_that_give_no_end_say_why() {
        let moving = report(&[0.0, 0.5], 1.0);
        let two = format!("{moving}{moving}");
        let curves = "no two columns are a displacement and a velocity of one axis";
        let names = "line 2: 3 numbers under 7 names: a name must have no blank in it";
        for (text, message) in [
            ("dt_s,depth_m\n1,2\n", "no X-Y report of Abaqus, and no rbdout or nodout of LS-DYNA"),
            (&moving, "the run does not come to its end: 2 m/s at 1.25 m after 0.5 s"),
            ("X U1 V2\n0 0 3\n", curves),
            ("X U1 V1\n", curves),
            ("X U:U1 PI: RIGID V:V1 PI: RIGID\n0 0 3\n", names),
            (&two, "line 8: a second table begins"),
            ("X U1 V1\n1 0 3\n1 1 3\n", "the run does not come to its end: the time 1 s comes behind 1 s"),
            ("X U1 V1\n1 0 0\n2 1 3\n", "the run does not come to its end: it begins at rest, or behind the target"),
        ] {
            assert_eq!(end_of(text, &READING).unwrap_err().to_string(), message);
        }
        let nan = end_of("X U1 V1\n0 0 3\n1 nan 3\n", &READING).unwrap();
        assert!(nan.state.depth.is_nan(), "a run of no numbers is judged, and fails");
    }

    #[test]
    fn the_fields_of_a_node_need_no_blank_between_them() {
        let state = |time: f64, x: &str, v: &str| {
            let head = " n o d a l   p r i n t   o u t   f o r   t i m e  s t e p       1  ( at time";
            let fields: String =
                [x, "0", "0", v, "0", "0", "0", "0", "0", "0", "0", "0"].map(|n| format!("{n:>12}")).concat();
            format!("{head} {time:e} )\n\n nodal point  x-disp     y-disp\n        7 {fields}\n")
        };
        let text = format!("{}{}", state(0.0, "0", "-1.00000E+02"), state(1e-3, "-5.00000E-02", "1.000000E+00"));
        assert!(text.contains("           0-1.00000E+02  "), "{text}");
        let end = end_of(&text, &READING).unwrap();
        assert!((end.state.time - 1e-3 * 100.0 / 101.0).abs() < 1e-15, "{end:?}");
    }
}
