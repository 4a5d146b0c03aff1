//! Formulas as texts, and the texts that one slip makes of them: a name, number, operator or bracket changed, left out or exchanged.

use std::ops::Range;

use crate::physics::expression::{Bound, Known, Tape, Unit};

/// A text ([`crate::physics::expression`]) that has a value.
#[derive(Debug)]
pub(super) struct Formula {
    pub text: String,
    tape: Tape,
}

impl Formula {
    /// `text`, in which `names` may stand; `None` where it is no formula.
    pub(super) fn read(text: &str, names: &[&'static str]) -> Option<Self> {
        let known: Vec<Known> = names.iter().map(|name| Known { name, value: 1.0, unit: Unit::NONE }).collect();
        let tape = Tape::read(text, &known, Unit::NONE).ok()?;
        Some(Self { text: tape.to_text(), tape })
    }

    /// Its value, by a value of each name.
    pub(super) fn value(&self, values: &[f64]) -> f64 {
        let bound: Bound = self.tape.bind(values);
        bound.eval(0.0, 0.0)
    }
}

/// A piece of a formula: a name, a number, or one sign.
fn tokens(text: &str) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || c == '.';
    for c in text.chars().filter(|c| *c != ' ') {
        match all.last_mut() {
            Some(last) if is_of_word(c) && last.ends_with(is_of_word) => last.push(c),
            _ => all.push(c.to_string()),
        }
    }
    all
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_ascii_alphabetic())
}

/// Functions that stand for each other.
const FUNCTIONS: [&str; 7] = ["sqrt", "exp", "log", "log10", "sin", "cos", "atan"];

fn is_operator(token: &str) -> bool {
    ["+", "-", "*", "/", "^"].contains(&token)
}

/// How many of `tokens` are the operand with which they begin, where a bracket opens and closes by these signs and `weaker` operators end it.
fn operand<'a>(tokens: impl Iterator<Item = &'a String>, (opens, closes): (&str, &str), weaker: &str) -> usize {
    let mut depth = 0_u32;
    let is_inside = |token: &&String| {
        let is_end = depth == 0 && (token.as_str() == closes || weaker.contains(token.as_str()));
        depth = match token.as_str() {
            token if token == opens => depth + 1,
            token if token == closes => depth.saturating_sub(1),
            _ => depth,
        };
        !is_end
    };
    tokens.take_while(is_inside).count()
}

/// The texts that one slip makes of `text`, in which `names` may stand.
pub(super) fn slips(text: &str, names: &[&str]) -> Vec<String> {
    let tokens = tokens(text);
    let mut all = Vec::new();
    let mut with = |range: Range<usize>, by: &str| {
        let part = |range: &[String]| range.concat();
        all.push(part(&tokens[..range.start]) + by + &part(&tokens[range.end..]));
    };
    // What is left out first: of two texts of one value the shorter one is told.
    for (at, token) in tokens.iter().enumerate().filter(|(_, token)| is_operator(token)) {
        let weaker = match token.as_str() {
            "+" | "-" => "+-",
            "*" | "/" => "+-*/",
            _ => "+-*/^",
        };
        with(at - operand(tokens[..at].iter().rev(), (")", "("), weaker)..at + 1, "");
        with(at..at + 1 + operand(tokens[at + 1..].iter(), ("(", ")"), weaker), "");
    }
    for (at, token) in tokens.iter().enumerate() {
        let here = at..at + 1;
        if let Ok(number) = token.parse::<f64>() {
            for other in [
                1.0,
                0.5 * number,
                2.0 * number,
                number + 1.0,
                number - 1.0,
                0.1 * number,
                10.0 * number,
                1e3 * number,
                1e-3 * number,
            ] {
                with(here.clone(), &other.to_string());
            }
        } else if FUNCTIONS.contains(&token.as_str()) {
            for other in FUNCTIONS.into_iter().filter(|other| other != token).chain([""]) {
                with(here.clone(), other);
            }
        } else if is_name(token) {
            for name in names.iter().filter(|name| *name != token) {
                with(here.clone(), name);
            }
            with(here.clone(), "1");
            for (before, behind) in [("2*", ""), ("", "/2"), ("", "^2"), ("sqrt(", ")"), ("1/", "")] {
                with(here.clone(), &format!("({before}{token}{behind})"));
            }
        } else if is_operator(token) {
            for other in ["+", "-", "*", "/"] {
                with(here.clone(), other);
            }
        }
    }
    // Two names exchanged.
    let is_quantity = |token: &&String| is_name(token) && !FUNCTIONS.contains(&token.as_str());
    let mut words: Vec<&String> = tokens.iter().filter(is_quantity).collect();
    words.sort();
    words.dedup();
    for (place, one) in words.iter().enumerate() {
        for other in &words[place + 1..] {
            let exchanged = |token| match () {
                () if token == *one => *other,
                () if token == *other => *one,
                () => token,
            };
            all.push(tokens.iter().map(|token| exchanged(token).as_str()).collect());
        }
    }
    // A bracket at another place, or a pair of them left out.
    for (at, _) in tokens.iter().enumerate().filter(|(_, token)| ["(", ")"].contains(&token.as_str())) {
        for place in 0..tokens.len() {
            let mut moved = tokens.clone();
            let bracket = moved.remove(at);
            moved.insert(place, bracket);
            all.push(moved.concat());
        }
        if tokens[at] == "(" {
            for close in at + 1..tokens.len() {
                if tokens[close] == ")" {
                    let kept = |place: usize| place != at && place != close;
                    all.push((0..tokens.len()).filter(|place| kept(*place)).map(|place| &*tokens[place]).collect());
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_leave_out_exchange_and_move() {
        let is_made = |of: &str, slip: &str| slips(of, &["k"]).iter().any(|text| text == slip);
        for slip in ["M", "M+Q", "M+k*Q", "M-D*Q", "M+D/Q", "M+D*k", "D+M*Q", "M+D*(Q/2)"] {
            assert!(is_made("M + D*Q", slip), "{slip}");
        }
        for slip in ["P/D*(M+Q)", "P/(D*M+Q)", "P/(D*(Q))", "P/(D*(M-Q))"] {
            assert!(is_made("P/(D*(M + Q))", slip), "{slip}");
        }
        assert!(is_made("sqrt(M - k)", "(M-k)") && is_made("log(M)", "log10(M)"));
    }
}
