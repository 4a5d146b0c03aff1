//! What do the numbers of the answers show by themselves?

use super::causes::{Cause, Certainty};

/// Digits up to which an answer has few.
const FEW_DIGITS: usize = 9;
/// Decimals up to which an answer has few.
const FEW_DECIMALS: usize = 8;

/// What the numbers themselves show: single precision, or few digits.
pub(super) fn few_digits(numbers: &[f64], failed: usize) -> Option<Cause> {
    if numbers.len() < 10 {
        return None;
    }
    if numbers.iter().all(|number| f64::from(*number as f32) == *number) {
        let statement = "every number is one of single precision (f32)".to_owned();
        return Some(Cause::plain("single-precision", statement, Certainty::Certain, failed, failed));
    }
    let all: Vec<(usize, usize)> = numbers.iter().map(|number| digits(*number)).collect();
    let most = all.iter().map(|(significant, _)| *significant).max().unwrap_or(0);
    let decimals = all.iter().map(|(_, decimals)| *decimals).max().unwrap_or(0);
    let statement = if most <= FEW_DIGITS {
        format!("numbers are printed with at most {most} digits: print 17")
    } else if decimals <= FEW_DECIMALS {
        format!("numbers are printed with at most {decimals} decimals: print 17 digits")
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
