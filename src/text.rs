//! How do numbers and foreign text read: in messages, on a terminal, on a page?

use std::fmt::{self, Display};

/// A number in a message: plain from 1e-5 up to 1e16, scientific beyond; it reads back to the same f64.
///
/// `Display` of f64 writes 1e300 with 301 digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown(pub f64);

impl Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = *self;
        if value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs()) {
            write!(f, "{value}")
        } else {
            write!(f, "{value:e}")
        }
    }
}

/// Mantissa and exponent of a finite `value` after rounding to `digits`: 9.996 with three digits is `1.00` and 1.
fn scientific(value: f64, digits: usize) -> (String, i32) {
    let mut mantissa = format!("{value:.*e}", digits.max(1) - 1);
    let exponent = mantissa.find('e').map_or(String::new(), |at| mantissa.split_off(at));
    (mantissa, exponent.trim_start_matches('e').parse().unwrap_or(0))
}

/// `value` to `digits` significant digits with an SI prefix: `("144.826", "m")`; scientific beyond the prefixes.
pub fn prefixed(value: f64, digits: usize) -> (String, &'static str) {
    const PREFIXES: [&str; 9] = ["p", "n", "µ", "m", "", "k", "M", "G", "T"];
    if value == 0.0 || !value.is_finite() {
        // Zero without its sign.
        return ((value + 0.0).to_string(), "");
    }
    let (mantissa, exponent) = scientific(value, digits);
    let scientific = format!("{mantissa}e{exponent}");
    let thousands = exponent.div_euclid(3);
    let Some(prefix) = usize::try_from(thousands + 4).ok().and_then(|index| PREFIXES.get(index)) else {
        return (scientific, "");
    };
    let scaled = scientific.parse().unwrap_or(value) / 10f64.powi(3 * thousands);
    let decimals = digits.saturating_sub(1 + exponent.rem_euclid(3) as usize);
    (format!("{scaled:.decimals$}"), prefix)
}

/// `value` with an SI prefix and six significant digits: `144.826 mm`, `8.48230 MN`.
pub fn engineering(value: f64, unit: &str) -> String {
    let (number, prefix) = prefixed(value, 6);
    format!("{number} {prefix}{unit}")
}

/// `value` to six significant digits without a prefix: plain between 1e-4 and 1e7, scientific beyond.
pub fn significant(value: f64) -> String {
    digits_text(value, 6)
}

/// `value` to so many significant `digits`, 1 to 17, as [`significant`].
pub fn digits_text(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let behind = digits - 1;
    if (1e-4..1e7).contains(&value.abs()) {
        let decimals = (behind - value.abs().log10().floor() as i32).clamp(0, 17) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", behind as usize)
    }
}

/// The digits that two numbers, neither negative, have in common, and in brackets those from `low` to `high`: two of them, or
/// as many as give `high` six: `0.14482678906(54..57)`. The numbers shown hold those given between them.
pub fn digits_between(low: f64, high: f64) -> String {
    let width = high - low;
    if low == high || !width.is_finite() || !(1e-12..1e12).contains(&high) {
        return if low == high { Shown(low).to_string() } else { format!("({}..{})", Shown(low), Shown(high)) };
    }
    let places = (2.0 - width.log10()).max(6.0 - high.log10()).floor().clamp(0.0, 30.0) as usize;
    let exact = |value: f64| format!("{value:.60}");
    let cut = |text: &str| match text.find('.') {
        Some(point) if places > 0 => point + 1 + places,
        Some(point) => point,
        None => text.len(),
    };
    let (low, high) = (exact(low), exact(high));
    let floor = low[..cut(&low)].to_owned();
    let mut ceiling: Vec<u8> = high[..cut(&high)].bytes().collect();
    if high[cut(&high)..].bytes().any(|digit| digit.is_ascii_digit() && digit != b'0') {
        let mut carries = true;
        for digit in ceiling.iter_mut().rev().filter(|digit| **digit != b'.') {
            *digit = if *digit == b'9' { b'0' } else { *digit + 1 };
            carries = *digit == b'0';
            if !carries {
                break;
            }
        }
        if carries {
            ceiling.insert(0, b'1');
        }
    }
    let ceiling: String = ceiling.into_iter().map(char::from).collect();
    let common = floor.bytes().zip(ceiling.bytes()).take_while(|(a, b)| a == b).count();
    let common = if floor.len() == ceiling.len() { common } else { 0 };
    format!("{}({}..{})", &floor[..common], &floor[common..], &ceiling[common..])
}

/// `value` with `format` where there is one, else a dash.
pub fn or_dash(value: Option<f64>, format: impl FnOnce(f64) -> String) -> String {
    value.map_or_else(|| "-".to_owned(), format)
}

/// A relative error: two digits, `0` when there is none, a dash where it is unknown.
pub fn error_text(value: Option<f64>) -> String {
    or_dash(value, |error| if error == 0.0 { "0".to_owned() } else { format!("{error:.1e}") })
}

/// `value` with `digits` significant digits: plain from 1e-3 to 1e5, else as `1.23 × 10⁻⁵`.
///
/// For a page: minus signs and infinities are those of print, and no space inside breaks.
pub fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if value.is_nan() {
        return "not a number".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    let (mantissa, exponent) = scientific(value, digits);
    if (-3..5).contains(&exponent) {
        let decimals = (digits.max(1) as i32 - 1 - exponent).max(0) as usize;
        return trimmed(&format!("{value:.decimals$}")).replace('-', "−");
    }
    let mantissa = trimmed(&mantissa).replace('-', "−");
    if mantissa == "1" {
        return power_of_ten(exponent);
    }
    format!("{mantissa}\u{a0}×\u{a0}{}", power_of_ten(exponent))
}

/// Without zeros at the end of a decimal fraction.
fn trimmed(digits: &str) -> &str {
    if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits }
}

/// `10⁻⁵`.
pub fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(exponent))
}

/// `⁻⁵`.
pub fn superscript(number: i32) -> String {
    let raise = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(u32::from(digit) - u32::from('0') + 0x2070).unwrap_or(digit),
    };
    number.to_string().chars().map(raise).collect()
}

/// `3 claims`, `1 claim`.
pub fn count<N: Copy + Display + PartialEq + From<u8>>(number: N, noun: &str) -> String {
    let plural = if number == N::from(1) { "" } else { "s" };
    format!("{number} {noun}{plural}")
}

/// Whether `c` drives a terminal, ends a line or turns the direction of writing.
pub fn steers(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Foreign text on one line in which nothing steers: what does so is replaced by U+FFFD.
pub fn harmless(text: &str) -> String {
    text.chars().map(|c| if steers(c) { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// As [`harmless`], with line breaks and tabs as spaces. Escaping for the format is left to its writer.
pub fn one_line(text: &str) -> String {
    harmless(&text.replace(['\n', '\r', '\t', '\u{2028}', '\u{2029}'], " "))
}

/// A cell or key as a message may quote it: [`harmless`], and forty characters.
pub fn shortened(text: &str) -> String {
    harmless(&clipped(text, 40))
}

/// The first `most` characters of `text`, with `…` behind them where it is longer.
pub fn clipped(text: &str, most: usize) -> String {
    let (first, rest) = text.char_indices().nth(most).map_or((text, ""), |(end, _)| text.split_at(end));
    if rest.is_empty() { first.to_owned() } else { format!("{first}…") }
}

/// `text` in lines of `most` characters, broken at spaces; a longer word, such as a path, stays whole.
pub fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if lines[last].is_empty() {
            lines[last].push_str(word);
        } else if lines[last].chars().count() + 1 + word.chars().count() > most {
            lines.push(word.to_owned());
        } else {
            lines[last].push(' ');
            lines[last].push_str(word);
        }
    }
    lines
}

/// Longest word that may be a misspelling, in bytes.
const WORD_LENGTH_MAX: usize = 60;

/// Remedy for a misspelt word.
pub(crate) fn did_you_mean(known: &str) -> String {
    format!("did you mean `{known}`?")
}

/// The one of `known` that `text` is most likely a misspelling of.
pub(crate) fn nearest<'a>(text: &str, known: &[&'a str]) -> Option<&'a str> {
    let distance = |known: &&str| strsim::damerau_levenshtein(&text.to_lowercase(), &known.to_lowercase());
    // A long text is no misspelling.
    let candidates = known.iter().copied().filter(|_| text.len() <= WORD_LENGTH_MAX);
    let best = candidates.min_by_key(distance)?;
    let length = best.chars().count();
    // One slip in three letters; in two letters one; a unit of one letter has no misspelling.
    (distance(&best) <= (length / 3).max(1).min(length.saturating_sub(1))).then_some(best)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a text that is no number is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn digits_between_two_numbers_hold_both() {
        for (low, high, text) in [
            (0.25, 0.25, "0.25"),
            (0.144_826_789_065_454, 0.144_826_789_065_457, "0.14482678906545(39..71)"),
            (0.999_999_999_999_999_9, 1.0, "(0.99999999999999988..1.00000000000000000)"),
            (177.949_686_027_945_63, 177.949_686_027_945_66, "177.9496860279456(31..60)"),
            (0.0, 0.5, "0.(000000..500000)"),
            (136.2, 149.9, "1(36.199..49.901)"),
            (1_936_200.0, 2_149_900.0, "(1936200..2149900)"),
            (1.0, f64::INFINITY, "(1..inf)"),
            (1e-20, 2e-20, "(1e-20..2e-20)"),
        ] {
            assert_eq!(digits_between(low, high), text);
        }
    }

    #[test]
    fn a_number_in_a_message_is_short_and_reads_back() {
        for (value, text) in [
            (0.0, "0"),
            (300.0, "300"),
            (-0.05, "-0.05"),
            (1e-5, "0.00001"),
            (1e-300, "1e-300"),
            (-2.5e300, "-2.5e300"),
            (f64::MAX, "1.7976931348623157e308"),
            (5e-324, "5e-324"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(Shown(value).to_string(), text);
        }
        for bits in (0..2000).map(|i| 0x0010_0000_0000_0001_u64.wrapping_mul(i * 7919 + 1)) {
            let value = f64::from_bits(bits);
            if value.is_finite() {
                let text = Shown(value).to_string();
                assert!(text.len() <= 24, "{text}");
                assert_eq!(text.parse::<f64>().unwrap().to_bits(), bits);
            }
        }
    }

    #[test]
    fn engineering_prefixes_turn_at_a_thousand_after_rounding() {
        assert_eq!(engineering(0.144_826_2, "m"), "144.826 mm");
        assert_eq!(engineering(999.999_9, "s"), "1.00000 ks");
        assert_eq!(engineering(-8.482_3e6, "N"), "-8.48230 MN");
        assert_eq!(engineering(0.0, "m"), "0 m");
        assert_eq!(engineering(-0.0, "m"), "0 m");
        assert_eq!(engineering(f64::NEG_INFINITY, "m"), "-inf m");
        assert_eq!(engineering(1e-30, "m"), "1.00000e-30 m");
        assert_eq!((prefixed(1.21e-6, 2), prefixed(8.3e4, 2)), (("1.2".to_owned(), "µ"), ("83".to_owned(), "k")));
    }

    #[test]
    fn significant_digits_are_six_everywhere() {
        assert_eq!(significant(6.215_430_1), "6.21543");
        assert_eq!(significant(1e-9), "1.00000e-9");
        assert_eq!(significant(123_456.7), "123457");
    }

    #[test]
    fn numbers_of_a_page_keep_their_digits_and_round_before_they_choose_a_form() {
        assert_eq!(number(0.0, 3), "0");
        assert_eq!(number(2.0, 3), "2");
        assert_eq!(number(0.0126, 2), "0.013");
        assert_eq!(number(-1.25, 3), "−1.25");
        assert_eq!(number(99_999.0, 2), "10⁵");
        assert_eq!(number(12_345.0, 3), "12345");
        assert_eq!(number(1.234e-13, 3), "1.23\u{a0}×\u{a0}10⁻¹³");
        assert_eq!(number(-4.5e20, 3), "−4.5\u{a0}×\u{a0}10²⁰");
        assert_eq!(number(f64::NAN, 3), "not a number");
        assert_eq!(number(f64::NEG_INFINITY, 3), "−∞");
    }

    #[test]
    fn foreign_text_cannot_act() {
        assert_eq!(one_line("a\nb\u{1b}[2Jc\u{202e}d"), "a b\u{fffd}[2Jc\u{fffd}d");
        assert_eq!(harmless("a\nb"), "a\u{fffd}b");
    }

    #[test]
    fn long_text_breaks_at_spaces_alone() {
        assert_eq!(wrapped("one  two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("a-path-that-is-long x", 4), ["a-path-that-is-long", "x"]);
    }
}
