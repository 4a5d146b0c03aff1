//! What do the numbers of the answers show by themselves?

use super::QUANTITIES;
use super::causes::{Cause, Certainty};
use crate::physics::State;
use crate::text::count;

/// Digits up to which an answer has few.
const FEW_DIGITS: usize = 9;
/// Decimals up to which an answer has few, and digits that half of the numbers then have at most.
const FEW_DECIMALS: usize = 9;
const HALF_DIGITS: usize = 12;

/// What the numbers of `ends` themselves show, all or those of some quantities: single precision, or few digits. That few are printed
/// need not be what is wrong ([`is_cut_off`]).
pub(super) fn few_digits(ends: impl Iterator<Item = State>, failed: usize) -> Option<Cause> {
    let mut each = [const { Vec::new() }; 3];
    for State { depth, time, velocity } in ends {
        each[0].push(depth);
        each[1].push(time);
        each[2].push(velocity);
    }
    let shown = each.map(of_numbers);
    let (id, first) = shown.iter().flatten().next()?;
    let of_all = shown.iter().all(|of| of.as_ref().is_some_and(|(_, what)| what == first));
    let listed: Vec<String> = if of_all {
        vec![format!("every number {first}")]
    } else {
        let same = QUANTITIES.iter().zip(&shown).filter_map(|(kind, of)| Some((kind, of.as_ref()?)));
        same.filter(|(_, (other, _))| other == id).map(|(kind, (_, what))| format!("every {kind} {what}")).collect()
    };
    let (advice, certainty) =
        if *id == "few-digits" { (": print 17 digits", Certainty::Likely) } else { ("", Certainty::Certain) };
    let statement = format!("{}{advice}", listed.join(", "));
    Some(Cause::plain(id, statement, certainty, failed, failed))
}

/// That all `ends` are one.
pub(super) fn same_answer(mut ends: impl Iterator<Item = State>, failed: usize) -> Option<Cause> {
    let first = ends.next()?;
    let State { depth, time, velocity } = first;
    let statement = format!("every question has the same answer: x = {depth} m, t = {time} s, V = {velocity} m/s");
    ends.all(|end| end == first).then(|| Cause::plain("same-answer", statement, Certainty::Certain, failed, failed))
}

/// Whether each answer, with the exact one beside it, errs by no more than half a unit of its last decimal, or of its last digit, the
/// most that any answer has of its quantity; a relative error of `accuracy` may come on top.
pub(super) fn is_cut_off(ends: &[(State, State)], accuracy: f64) -> bool {
    let of: [fn(&State) -> f64; 3] = [|end| end.depth, |end| end.time, |end| end.velocity];
    of.iter().all(|of| {
        let numbers = || ends.iter().map(|(found, exact)| (of(found), of(exact))).filter(|(found, _)| *found != 0.0);
        let (most, decimals) = numbers()
            .map(|(found, _)| digits(found))
            .fold((0, 0), |most, (digits, decimals)| (most.0.max(digits), most.1.max(decimals)));
        // Of each quantity, in its unit and over itself.
        let grain = HALF * 0.1_f64.powi(i32::try_from(decimals).unwrap_or(i32::MAX));
        let part = HALF * 0.1_f64.powi(i32::try_from(most).unwrap_or(i32::MAX) - 1);
        numbers().all(|(found, exact)| (found - exact).abs() <= grain + accuracy * exact.abs())
            || numbers().all(|(found, exact)| (found - exact).abs() <= (part + accuracy) * exact.abs())
    })
}

/// Half a unit of the last digit, and a little for a number that is not represented.
const HALF: f64 = 0.500_000_1;

/// What `numbers` show, as id and words; zeros say nothing.
pub(super) fn of_numbers(mut numbers: Vec<f64>) -> Option<(&'static str, String)> {
    numbers.retain(|number| *number != 0.0);
    if numbers.len() < 10 {
        return None;
    }
    if numbers.iter().all(|number| f64::from(*number as f32) == *number) {
        return Some(("single-precision", "is one of single precision (f32)".to_owned()));
    }
    numbers.sort_by(|one, other| one.abs().total_cmp(&other.abs()));
    let all: Vec<(usize, usize)> = numbers.iter().map(|number| digits(*number)).collect();
    // Numbers cut behind a decimal have the more digits the larger they are, and those cut behind a digit the fewer decimals.
    let halves = all.split_at(all.len() / 2);
    let most = |of: fn(&(usize, usize)) -> usize| {
        let [small, large] = [halves.0, halves.1].map(|half| half.iter().map(of).max().unwrap_or(0));
        (small.max(large), small == large)
    };
    let (digits, _) = most(|(digits, _)| *digits);
    let (decimals, is_even) = most(|(_, decimals)| *decimals);
    let short = all.iter().filter(|(digits, _)| *digits <= HALF_DIGITS).count();
    let is_of_decimals = decimals <= FEW_DECIMALS && 2 * short >= all.len();
    let what = if is_of_decimals && (is_even || digits > FEW_DIGITS) {
        count(decimals, "decimal")
    } else if digits <= FEW_DIGITS {
        count(digits, "digit")
    } else {
        return None;
    };
    Some(("few-digits", format!("is printed with at most {what}")))
}

/// Significant digits, and decimals, of `number` as it is written.
fn digits(number: f64) -> (usize, usize) {
    let text = format!("{number:e}");
    let mantissa = text.split('e').next().unwrap_or_default();
    let significant = mantissa.chars().filter(char::is_ascii_digit).count();
    let plain = number.to_string();
    (significant, plain.split_once('.').map_or(0, |(_, behind)| behind.len()))
}
