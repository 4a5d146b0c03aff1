//! What do the numbers of the answers show by themselves?

use super::QUANTITIES;
use super::causes::{Cause, Certainty};
use crate::physics::State;
use crate::text::count;

/// Digits up to which an answer has few.
const FEW_DIGITS: usize = 9;
/// Decimals up to which an answer has few.
const FEW_DECIMALS: usize = 8;

/// What the numbers of `ends` themselves show, all or those of one quantity: single precision, or few digits.
pub(super) fn few_digits(ends: impl Iterator<Item = State>, failed: usize) -> Option<Cause> {
    let mut each = [const { Vec::new() }; 3];
    for State { depth, time, velocity } in ends {
        each[0].push(depth);
        each[1].push(time);
        each[2].push(velocity);
    }
    let of_each = || (0..3).find_map(|which| of_numbers(QUANTITIES[which], &each[which], failed));
    of_numbers("number", &each.concat(), failed).or_else(of_each)
}

/// The same of the `numbers` of one kind; zeros say nothing.
pub(super) fn of_numbers(kind: &str, numbers: &[f64], failed: usize) -> Option<Cause> {
    let numbers: Vec<f64> = numbers.iter().copied().filter(|number| *number != 0.0).collect();
    if numbers.len() < 10 {
        return None;
    }
    if numbers.iter().all(|number| f64::from(*number as f32) == *number) {
        let statement = format!("every {kind} is one of single precision (f32)");
        return Some(Cause::plain("single-precision", statement, Certainty::Certain, failed, failed));
    }
    let all: Vec<(usize, usize)> = numbers.iter().map(|number| digits(*number)).collect();
    let most = all.iter().map(|(significant, _)| *significant).max().unwrap_or(0);
    let decimals = all.iter().map(|(_, decimals)| *decimals).max().unwrap_or(0);
    let statement = if most <= FEW_DIGITS {
        format!("every {kind} is printed with at most {}: print 17", count(most, "digit"))
    } else if decimals <= FEW_DECIMALS {
        format!("every {kind} is printed with at most {}: print 17 digits", count(decimals, "decimal"))
    } else {
        return None;
    };
    Some(Cause::plain("few-digits", statement, Certainty::Certain, failed, failed))
}

/// Significant digits, and decimals, of `number` as it is written.
fn digits(number: f64) -> (usize, usize) {
    let text = format!("{number:e}");
    let mantissa = text.split('e').next().unwrap_or_default();
    let significant = mantissa.chars().filter(char::is_ascii_digit).count();
    let plain = number.to_string();
    (significant, plain.split_once('.').map_or(0, |(_, behind)| behind.len()))
}
