//! Transcripts: what commands said and wrote when a person last read it, for comparison with what they say today.
//!
//! A transcript is a text file of `verification/transcript`. Its lines begin with what they are:
//!
//! ```text
//! # a remark, in front of a run
//! $ solve own.toml --trajectory path.csv       a run, its words quoted as for a shell; shipped scenes are NAME.toml
//! - figures/                                   files whose names hold this are not compared
//! ~ html                                       files whose names hold this are compared by their sums alone
//! < own.toml                                   a file that the run is given; without lines, the last one of that name
//! = 0                                          its exit code
//! > stdout                                     what it said there, or `stderr`, or a file that it wrote
//! |...                                         a line of that
//! ```
//!
//! All from `=` on is made by a run; a person writes the rest.

use std::borrow::Cow;
use std::fmt::{self, Write as _};

use rayon::prelude::*;

use super::claim::{Found, NotMeasured};
use super::program::Program;

macro_rules! recorded {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../verification/transcript/", $name, ".txt")))),*]
    };
}

/// The transcripts of `verification/transcript`, by file name without its ending.
pub const TRANSCRIPTS: &[(&str, &str)] = recorded![
    "solve", "methods", "paths", "critical", "sweep", "numbers", "batch", "converge", "audit", "studies", "bench",
    "report", "suites", "peers", "spelled", "refused", "places", "paper", "options", "unusual", "misread", "laws",
    "branches", "mistakes", "rare",
];

/// Runs of the program, and what they said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transcript(Vec<Run>);

/// One run.
#[derive(Clone, Debug, Default, PartialEq)]
struct Run {
    remarks: Vec<String>,
    line: String,
    left_out: Vec<String>,
    summed: Vec<String>,
    given: Vec<Text>,
    code: i32,
    said: Vec<Text>,
}

/// A named text.
#[derive(Clone, Debug, PartialEq)]
struct Text {
    name: String,
    lines: Vec<String>,
}

/// How a run of today differs from the transcript.
#[derive(Debug, Default)]
pub struct Differences {
    /// Lines that differ.
    pub lines: usize,
    /// The first of them.
    pub first: String,
}

impl Transcript {
    /// The transcript that `text` holds.
    ///
    /// # Errors
    /// [`NotMeasured`]: a line that has no place in one.
    pub fn read(text: &str) -> Found<Self> {
        let mut runs: Vec<Run> = Vec::new();
        let mut remarks = Vec::new();
        let mut is_given = false;
        for (number, line) in text.lines().enumerate() {
            let misplaced = || NotMeasured::broken(format!("line {} of the transcript: {line}", number + 1));
            let (kind, rest) = line.split_at_checked(1).unwrap_or(("", ""));
            let rest_trimmed = rest.trim();
            if kind == "#" || line.trim().is_empty() {
                remarks.push(line.to_owned());
                continue;
            }
            if kind == "$" {
                let remarks = std::mem::take(&mut remarks);
                runs.push(Run { remarks, line: rest_trimmed.to_owned(), ..Run::default() });
                continue;
            }
            let run = runs.last_mut().ok_or_else(misplaced)?;
            let named = || Text { name: rest_trimmed.to_owned(), lines: Vec::new() };
            match kind {
                "-" => run.left_out.push(rest_trimmed.to_owned()),
                "~" => run.summed.push(rest_trimmed.to_owned()),
                "=" => run.code = rest_trimmed.parse().map_err(|_| misplaced())?,
                "<" => (run.given.push(named()), is_given = true).0,
                ">" => (run.said.push(named()), is_given = false).0,
                "|" => {
                    let texts = if is_given { &mut run.given } else { &mut run.said };
                    texts.last_mut().ok_or_else(misplaced)?.lines.push(rest.to_owned());
                }
                _ => return Err(misplaced()),
            }
        }
        Ok(Self(runs))
    }

    /// The same runs today.
    ///
    /// # Errors
    /// As [`Program::run`].
    pub fn again(&self, program: &Program) -> Found<Self> {
        let given = |i: usize, text: &Text| {
            let texts = self.0[..=i].iter().rev().flat_map(|run| &run.given);
            let lines = texts.filter(|other| other.name == text.name).find(|other| !other.lines.is_empty());
            (text.name.clone(), lines.map_or(String::new(), |text| text.lines.join("\n") + "\n"))
        };
        let again = |(i, run): (usize, &Run)| {
            let given: Vec<_> = run.given.iter().map(|text| given(i, text)).collect();
            run.again(&given, program)
        };
        program.waiting(|| self.0.par_iter().enumerate().map(again).collect::<Found<_>>()).map(Self)
    }

    /// How many runs.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is no run.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How `today` differs: text is equal and numbers are within `tolerance`, relative; see [`Numbers`].
    pub fn differences(&self, today: &Self, tolerance: f64) -> Differences {
        let mut found = Differences::default();
        let mut numbers = Numbers { tolerance, short: 0, rounded: Differences::default() };
        for (run, now) in self.0.iter().zip(&today.0) {
            found.take(run.code == now.code, || {
                format!("`{}` exits {} in place of {}: {}", run.line, now.code, run.code, now.last_words())
            });
            let [names, names_now] = [run, now].map(|run| run.said.iter().map(|text| &text.name).collect::<Vec<_>>());
            found.take(names == names_now, || format!("`{}` says {names_now:?} in place of {names:?}", run.line));
            for text in &run.said {
                let Some(other) = now.said.iter().find(|other| other.name == text.name) else { continue };
                for i in 0..text.lines.len().max(other.lines.len()) {
                    let [was, is] = [text, other].map(|text| text.lines.get(i).map_or("", String::as_str));
                    let place = || format!("`{}`, {} line {}: {is:?} in place of {was:?}", run.line, text.name, i + 1);
                    let is_there = i < text.lines.len() && i < other.lines.len();
                    found.take(is_there && numbers.agree(was, is, &place), place);
                }
            }
        }
        found.join(numbers.finish())
    }
}

impl Differences {
    fn take(&mut self, agrees: bool, place: impl FnOnce() -> String) {
        if !agrees {
            if self.lines == 0 {
                self.first = place();
            }
            self.lines += 1;
        }
    }

    fn join(mut self, other: Self) -> Self {
        if self.lines == 0 {
            self.first = other.first;
        }
        self.lines += other.lines;
        self
    }
}

impl Run {
    fn again(&self, given: &[(String, String)], program: &Program) -> Found<Self> {
        let (said, written) = program.run_apart(&self.line, given)?;
        let mut texts = vec![("stdout".to_owned(), said.out), ("stderr".to_owned(), said.err)];
        texts.extend(written);
        texts.retain(|(name, text)| !text.is_empty() && !self.left_out.iter().any(|part| name.contains(part)));
        let said_now = texts.into_iter().map(|(name, text)| {
            let most = if self.summed.iter().any(|part| name.contains(part)) { 0 } else { LINES_MAX };
            Text { lines: lasting(&name, &text, most), name }
        });
        Ok(Self { code: said.code, said: said_now.collect(), ..self.clone() })
    }

    /// What it said on standard error, as one line.
    fn last_words(&self) -> String {
        let said = self.said.iter().filter(|text| text.name == "stderr").flat_map(|text| &text.lines);
        said.flat_map(|line| line.split_whitespace()).collect::<Vec<_>>().join(" ")
    }
}

impl fmt::Display for Transcript {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for run in &self.0 {
            let mut text = run.remarks.iter().fold(String::new(), |text, remark| text + remark + "\n");
            let _ = writeln!(text, "$ {}", run.line);
            run.left_out.iter().for_each(|part| text.push_str(&format!("- {part}\n")));
            run.summed.iter().for_each(|part| text.push_str(&format!("~ {part}\n")));
            run.given.iter().for_each(|given| given.add_to(&mut text, '<'));
            let _ = writeln!(text, "= {}", run.code);
            run.said.iter().for_each(|said| said.add_to(&mut text, '>'));
            f.write_str(&text)?;
        }
        Ok(())
    }
}

impl Text {
    fn add_to(&self, text: &mut String, kind: char) {
        let _ = writeln!(text, "{kind} {}", self.name);
        self.lines.iter().for_each(|line| text.push_str(&format!("|{line}\n")));
    }
}

/// Where a line names what differs between two runs: the time, the machine, the build, the name of the program's file. What stands from the first mark up
/// to the second is left out; without a second one, the rest of the line.
const PASSING: [(&str, &str); 8] = [
    ("\"wall_ns\": ", ","),
    ("\"wall_ms\": ", ","),
    ("\"median_ns\": ", ","),
    ("\"low_ns\": ", ","),
    ("\"high_ns\": ", ","),
    (" time=\"", "\""),
    ("</code> with penetrode ", ""),
    ("Usage: ", " "),
];

/// Where what lasts of a JSON ends: behind it, what is fastest, or the environment of the run.
const END_OF_LASTING: [&str; 2] = ["\n  \"fastest\": [", "\n  \"environment\": {"];

/// Lines of a text that are kept at most, evenly.
const LINES_MAX: usize = 150;

/// The lines of `text`, the contents of the file `name`, without what differs between two runs; of more than `most`, and of
/// a page beside its tables, the sums of all, and as many lines, evenly.
fn lasting(name: &str, text: &str, most: usize) -> Vec<String> {
    let (text, rows) = match name.rsplit('.').next() {
        Some("html") => (&shown_of(text), Some(rows_of(text))),
        Some("svg") => (&drawn(text), None),
        _ => (&text.to_owned(), None),
    };
    let text = END_OF_LASTING.iter().fold(text.as_str(), |text, end| text.split(end).next().unwrap_or_default());
    let mut is_time = false;
    let timeless = text.lines().filter(|line| {
        let line = line.trim();
        // A time that was not taken is null, on one line.
        let is_left_out = is_time || line.starts_with("\"time\": {") || line.starts_with("\"time\": null");
        is_time = line.starts_with("\"time\": {") || is_time && !line.starts_with('}');
        !is_left_out
    });
    let passing = |text: &str| PASSING.into_iter().filter(|(from, _)| text.contains(from)).collect::<Vec<_>>();
    let here = passing(text);
    let lines: Vec<String> = timeless.map(|line| lasting_line(line, &here)).collect();
    let kept_rows: Option<Vec<String>> = rows.as_deref().map(|rows| {
        let here = passing(rows);
        rows.lines().map(|line| lasting_line(line, &here)).collect()
    });
    let kept = kept_rows.as_ref().unwrap_or(&lines);
    let count = kept.len();
    // An odd number, so that each key of the objects of a list comes up.
    let each = if count > most { count.div_ceil(most.max(1)) | 1 } else { 1 };
    let mut lasting = Vec::new();
    if each > 1 || rows.is_some() || most == 0 {
        lasting.extend(sums(&lines));
    }
    if each > 1 && most > 0 {
        lasting.push(format!("{count} lines, one of {each} kept"));
    }
    lasting.extend(kept.iter().step_by(each).take(most).cloned());
    lasting
}

/// What changes when any of `lines` does: a hash of the words between their numbers, and for each of [`PARTS`] parts how many
/// numbers it has, how many of them are negative, and the weighted sum of the logarithms of their sizes. Round-off is left out.
fn sums(lines: &[String]) -> Vec<String> {
    let mut words = blake3::Hasher::new();
    let mut sums = Vec::new();
    for part in lines.chunks(lines.len().div_ceil(PARTS).max(1)) {
        let (mut count, mut negative, mut sum) = (0, 0, 0.0);
        for line in part {
            for piece in pieces(&plain(line)) {
                if let Some(number) = piece.number {
                    count += 1;
                    if number.abs() >= Numbers::TINY {
                        negative += usize::from(number < 0.0);
                        // By its place, so that two that are exchanged show.
                        sum += (1.0 + f64::from(count % 101) / 101.0) * (40.0 + number.abs().ln());
                    }
                } else {
                    words.update(piece.text.as_bytes());
                    words.update(b" ");
                }
            }
        }
        sums.push(format!("{count} numbers, {negative} below zero, {sum:.9}"));
    }
    // Letters alone: digits would be numbers.
    let words: String = words.finalize().as_bytes()[..8].iter().map(|byte| char::from(b'a' + byte % 26)).collect();
    std::iter::once(format!("{} lines, words {words}", lines.len())).chain(sums).collect()
}

/// Parts of which [`sums`] are made.
const PARTS: usize = 8;

/// `line` with a star between the two marks of each of `passing`.
fn lasting_line(line: &str, passing: &[(&str, &str)]) -> String {
    let mut line = line.to_owned();
    for &(from, to) in passing {
        let Some(start) = line.find(from).map(|at| at + from.len()) else { continue };
        let length = Some(to).filter(|to| !to.is_empty()).and_then(|to| line[start..].find(to));
        line.replace_range(start..length.map_or(line.len(), |length| start + length), "*");
    }
    line
}

/// A figure without the colours that its classes say again.
fn drawn(figure: &str) -> String {
    const SAID_AGAIN: [&str; 5] =
        [" fill=\"", " stroke=\"", " stroke-linejoin=\"", " stroke-dasharray=\"none\"", " font-family=\""];
    let mut drawn = figure.to_owned();
    for attribute in SAID_AGAIN {
        let mut parts = drawn.split(attribute);
        let first = parts.next().unwrap_or_default().to_owned();
        let is_whole = attribute.ends_with("none\"");
        let rest = parts.map(|part| if is_whole { part } else { part.split_once('"').map_or("", |(_, rest)| rest) });
        drawn = rest.fold(first, |drawn, part| drawn + part);
    }
    drawn
}

/// What a page shows, without its styles, scripts and marks, what it says of the build and its date, and up to what its run
/// says of the machine.
fn shown_of(page: &str) -> String {
    let page = page.split("id=\"reproduction\"").next().unwrap_or_default();
    let (before, behind) = page.split_once("<p class=\"quiet\">penetrode ").unwrap_or((page, ""));
    let page = before.to_owned() + behind.split_once("</time>").map_or(behind, |(_, behind)| behind);
    let mut shown = String::new();
    let mut hidden = false;
    for piece in page.split('<') {
        let (tag, text) = piece.split_once('>').unwrap_or(("", piece));
        for name in ["style", "script"] {
            hidden = tag.starts_with(name) || hidden && tag.strip_prefix('/') != Some(name);
        }
        if !hidden && !text.trim().is_empty() {
            shown.push_str(text.trim());
            shown.push('\n');
        }
    }
    shown
}

/// The rows of the tables of a page, cells parted by `|`, up to what its run says of the machine.
fn rows_of(page: &str) -> String {
    let page = page.split("id=\"reproduction\"").next().unwrap_or_default();
    let rows = page.split("<tr").skip(1).map(|row| row.split("</tr>").next().unwrap_or_default());
    let line = |row: &str| {
        let mut line = String::new();
        for piece in format!("<tr{row}").split('<') {
            let (tag, text) = piece.split_once('>').unwrap_or(("", piece));
            if tag.starts_with("td") || tag.starts_with("th") {
                line.push_str(" | ");
            }
            line.push_str(&text.replace('\n', " "));
        }
        line.trim().to_owned()
    };
    rows.map(line).collect::<Vec<_>>().join("\n")
}

/// Whether the lines of two runs agree: text but for blanks, numbers within a tolerance.
///
/// A number of less than ten digits is printed for people and must be the same, digit for digit. In one of fifty the last
/// digit may differ by one: another library of mathematics may round what lies near the middle to the other side. Below
/// [`Numbers::TINY`] numbers are errors and their bounds at round-off, and agree within a factor.
struct Numbers {
    /// Relative.
    tolerance: f64,
    /// Numbers printed for people, and those whose last digit differs.
    short: usize,
    rounded: Differences,
}

impl Numbers {
    /// Size below which a number is round-off.
    const TINY: f64 = 2e-12;
    /// Factor within which round-off agrees.
    const FACTOR: f64 = 30.0;
    /// What round-off leaves of an error that is not: 6e-9 of a depth is known to 1e-16 of it.
    const FLOOR: f64 = 1e-14;
    /// Digits from which on a number is one for programs.
    const LONG: usize = 10;

    fn agree(&mut self, was: &str, is: &str, place: &dyn Fn() -> String) -> bool {
        if was == is {
            self.short += pieces(was).iter().filter(|piece| piece.is_short()).count();
            return true;
        }
        let [was, is] = [was, is].map(plain);
        let [was, is] = [pieces(&was), pieces(&is)];
        was.len() == is.len() && was.iter().zip(&is).all(|(was, is)| self.piece_agrees(was, is, place))
    }

    fn piece_agrees(&mut self, was: &Piece<'_>, is: &Piece<'_>, place: &dyn Fn() -> String) -> bool {
        self.short += usize::from(was.is_short());
        let (Some(a), Some(b)) = (was.number, is.number) else { return was.text == is.text };
        let size = a.abs().max(b.abs());
        if was.text == is.text {
            return true;
        }
        if size < Self::TINY {
            let least = a.abs().min(b.abs());
            return size <= Self::FACTOR * least || least == 0.0 && size < Self::TINY / Self::FACTOR;
        }
        if was.is_short() && is.is_short() {
            let step = was.last_digit().min(is.last_digit());
            let is_rounded = was.text.contains('.') && (a - b).abs() <= 1.5 * step;
            self.rounded.take(!is_rounded, place);
            return is_rounded;
        }
        (a - b).abs() <= self.tolerance * size + Self::FLOOR
    }

    fn finish(self) -> Differences {
        if 50 * self.rounded.lines > self.short { self.rounded } else { Differences::default() }
    }
}

/// A number of a line, or the text between two, without blanks.
struct Piece<'a> {
    text: &'a str,
    number: Option<f64>,
}

impl Piece<'_> {
    fn is_short(&self) -> bool {
        self.number.is_some() && self.text.bytes().filter(u8::is_ascii_digit).count() < Numbers::LONG
    }

    /// Value of one in its last digit.
    fn last_digit(&self) -> f64 {
        let (mantissa, exponent) = self.text.split_once(['e', 'E']).unwrap_or((self.text, "0"));
        let behind = mantissa.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
        10f64.powi(exponent.parse::<i32>().unwrap_or(0) - behind)
    }
}

/// `line` with `5.4 × 10⁻¹⁶` written as `5.4e-16`.
fn plain(line: &str) -> Cow<'_, str> {
    if line.is_ascii() {
        return line.into();
    }
    let digit = |c| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|raised| raised == c);
    let raised = |c| if c == '⁻' { '-' } else { digit(c).and_then(|d| char::from_digit(d as u32, 10)).unwrap_or(c) };
    line.replace("\u{a0}×\u{a0}10", "e").chars().map(raised).collect::<String>().into()
}

/// The numbers of `line` and the words between them.
fn pieces(line: &str) -> Vec<Piece<'_>> {
    let mut pieces = Vec::new();
    for word in line.split_whitespace() {
        let mut rest = word;
        let mut before = ' ';
        while !rest.is_empty() {
            let length = if before.is_ascii_alphanumeric() { 0 } else { number_length(rest) };
            let (text, number) = match rest[..length].parse() {
                Ok(number) if length > 0 => (&rest[..length], Some(number)),
                _ => (&rest[..text_length(rest)], None),
            };
            pieces.push(Piece { text, number });
            before = text.chars().next_back().unwrap_or(' ');
            rest = &rest[text.len()..];
        }
    }
    pieces
}

/// Length of the number with which `text` begins, zero if it begins with none.
fn number_length(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let sign = usize::from(text.starts_with(['+', '-']));
    let mut length = sign + digits(sign);
    if length == sign {
        return 0;
    }
    if text[length..].starts_with('.') && digits(length + 1) > 0 {
        length += 1 + digits(length + 1);
    }
    if text[length..].starts_with(['e', 'E']) {
        let signed = length + 1 + usize::from(text[length + 1..].starts_with(['+', '-']));
        if digits(signed) > 0 {
            length = signed + digits(signed);
        }
    }
    length
}

/// Length of what stands before the next place where a number may begin.
fn text_length(text: &str) -> usize {
    let mut before = ' ';
    for (at, c) in text.char_indices() {
        if at > 0 && !before.is_ascii_alphanumeric() && number_length(&text[at..]) > 0 {
            return at;
        }
        before = c;
    }
    text.len()
}

/// A run, for [`misjudged`].
const SOLVED: &str = "# a remark\n$ solve own.toml\n- svg\n< own.toml\n|mass = 2\n= 0\n> stdout\n|  depth  144.826 mm, \
                      error 1.9e-16\n|  \"depth_m\": 0.14482620011221706,\n> path.csv\n|-1e-5,2,0.5\n";

/// Changes of it that are differences.
const SEEN: [(&str, &str); 17] = [
    ("= 0", "= 3"),
    ("depth  144", "time  144"),
    ("144.826", "144.827"),
    ("144.826", "-144.826"),
    ("144.826", "144.83"),
    ("mm,", "m,"),
    ("1.9e-16", "1.9e-14"),
    ("0.14482620011221706", "0.14482620051221706"),
    ("0.14482620011221706", "-0.14482620011221706"),
    ("0.14482620011221706", "0.144826"),
    ("0.14482620011221706", "null"),
    ("|-1e-5,2,0.5", "|1e-5,2,0.5"),
    ("|-1e-5,2,0.5", "|-1e-5,3,0.5"),
    ("|-1e-5,2,0.5", "|-1e-5,2,0.5\n|0,0,0"),
    ("|-1e-5,2,0.5", ""),
    ("> path.csv", "> other.csv"),
    ("|  depth  144.826 mm, error 1.9e-16\n", ""),
];

/// Changes of it that are round-off, or blanks.
const EQUAL: [(&str, &str); 4] =
    [("1706,", "1709,"), ("1.9e-16", "5.8e-16"), ("1.9e-16", "0"), ("  depth  ", " depth ")];

/// How many changes of a run were made, and those that are taken for what they are not.
///
/// # Errors
/// As [`Transcript::read`].
pub fn misjudged() -> Found<(usize, Vec<String>)> {
    let was = Transcript::read(SOLVED)?;
    let mut wrong = Vec::new();
    let all = SEEN.iter().map(|change| (change, true)).chain(EQUAL.iter().map(|change| (change, false)));
    for (&(from, to), differs) in all.clone() {
        let is_there = SOLVED.contains(from);
        let found = was.differences(&Transcript::read(&SOLVED.replacen(from, to, 1))?, 1e-9);
        if !is_there || (found.lines > 0) != differs {
            wrong.push(format!("{from} for {to}"));
        }
    }
    Ok((all.count(), wrong))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    #[test]
    fn a_transcript_is_written_as_it_was_read() {
        assert_eq!(Transcript::read(SOLVED).unwrap().to_string(), SOLVED);
        for text in ["= 0\n", "$ map\n|a\n", "$ map\n? b\n", "$ map\n= a\n"] {
            assert!(Transcript::read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn what_differs_is_seen_and_round_off_is_no_difference() {
        assert_eq!(misjudged().unwrap(), (SEEN.len() + EQUAL.len(), Vec::new()));
    }

    /// Of a text that is thinned, every line counts: its words, its numbers, their signs and their order.
    #[test]
    fn what_differs_in_a_line_that_is_not_kept_is_seen() {
        let text = |line: &str| {
            let lines =
                (0..1000).map(|i| if i == 444 { line.to_owned() } else { format!("{i} 1.25e-3 word {}", i + 1) });
            let said = lasting("a.csv", &lines.collect::<Vec<_>>().join("\n"), LINES_MAX);
            Transcript::read(&format!("$ map\n= 0\n> a.csv\n|{}\n", said.join("\n|"))).unwrap()
        };
        let was = text("444 1.25e-3 word 445");
        assert_eq!(was.differences(&text("444 1.25e-3 word 445"), 1e-9).lines, 0);
        assert_eq!(was.differences(&text("444 1.2500000000001e-3 word 445"), 1e-9).lines, 0);
        for other in [
            "444 1.26e-3 word 445",
            "444 -1.25e-3 word 445",
            "444 1.25e-3 work 445",
            "445 1.25e-3 word 444",
            "444 word 445",
        ] {
            assert!(was.differences(&text(other), 1e-9).lines > 0, "{other}");
        }
    }

    #[test]
    fn powers_of_ten_are_read_as_a_page_writes_them() {
        assert_eq!(plain("5.4\u{a0}×\u{a0}10⁻¹⁶ of it"), "5.4e-16 of it");
    }

    /// One in fifty may be the other side of a tie; when all are, it is another rounding.
    #[test]
    fn the_last_digit_of_a_number_for_people_may_differ_in_one_of_fifty() {
        let text = |last: u32, count: usize| {
            let line = |i: usize| format!("|1.23{}\n", if i < count { last } else { 4 });
            let lines = (0..100).map(line).collect::<Vec<_>>().concat();
            Transcript::read(&format!("$ map\n= 0\n> stdout\n{lines}")).unwrap()
        };
        assert_eq!(text(4, 0).differences(&text(5, 2), 1e-9).lines, 0);
        assert_eq!(text(4, 0).differences(&text(5, 3), 1e-9).lines, 3);
        assert_eq!(text(4, 0).differences(&text(6, 1), 1e-9).lines, 1);
    }

    #[test]
    fn what_passes_between_two_runs_is_left_out() {
        assert_eq!(lasting_line("    \"wall_ns\": 5031,", &PASSING), "    \"wall_ns\": *,");
        assert_eq!(lasting_line("<testcase name=\"a\" time=\"0.250\">", &PASSING), "<testcase name=\"a\" time=\"*\">");
        let json = "{\n  \"verdict\": \"passed\",\n  \"environment\": {\n    \"date\": 1\n  }\n}";
        assert_eq!(lasting("report.json", json, LINES_MAX), ["{", "  \"verdict\": \"passed\","]);
        let figure =
            "<path d=\"M1 2\" fill=\"none\" stroke=\"#5a6470\" class=\"s-muted\" stroke-dasharray=\"none\"></path>";
        assert_eq!(lasting("a.svg", figure, LINES_MAX), ["<path d=\"M1 2\" class=\"s-muted\"></path>"]);
        let page = |commit: u32, word: &str, style: &str| {
            let head = format!(
                "<style>{style}</style><p class=\"quiet\">penetrode 0.1.0, commit {commit}, <time>1</time></p>"
            );
            lasting("a.html", &format!("{head}<p>{word}</p><tr><th>a<td><b>1</b> m</td></tr>y"), LINES_MAX)
        };
        assert_eq!(page(1, "x", "").last().map(String::as_str), Some("| a | 1 m"));
        assert_eq!(page(1, "x", "p{}"), page(2, "x", ""));
        assert_ne!(page(1, "x", ""), page(1, "z", ""));
        let run = |time: &str| lasting("a.json", &format!("{{\n  \"error\": 2,\n  {time}\n}}"), LINES_MAX);
        assert_eq!(run("\"time\": null"), run("\"time\": {\n    \"median_ns\": 3,\n    \"samples\": 1\n  }"));
    }
}
