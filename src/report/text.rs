//! Numbers and foreign text as people read them.

/// `value` with `digits` significant digits: plain from 1e-3 to 1e5, else as `1.23 × 10⁻⁵`.
///
/// What is not finite is told so. Spaces inside do not break.
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
    let digits = digits.max(1);
    // The exponent after rounding: 9.996 with three digits is 1.00e1.
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..5).contains(&exponent) {
        let decimals =
            i32::try_from(digits).unwrap_or(i32::MAX).saturating_sub(1 + exponent).max(0).unsigned_abs() as usize;
        return trimmed(&format!("{value:.decimals$}")).replace('-', "−");
    }
    let mantissa = trimmed(mantissa).replace('-', "−");
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
    let raise = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(u32::from(digit) - u32::from('0') + 0x2070).unwrap_or(digit),
    };
    "10".chars().chain(exponent.to_string().chars().map(raise)).collect()
}

/// Text of others on one line, with nothing in it that acts on the page or terminal that shows it: controls and
/// marks that turn the direction of writing become U+FFFD. Escaping for the format is left to its writer.
pub fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '\n' | '\r' | '\t' | '\u{2028}' | '\u{2029}' => ' ',
            '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
            c if c.is_control() => '\u{fffd}',
            c => c,
        })
        .collect()
}

/// `3 claims`, `1 claim`.
pub fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// `text` in lines of `most` characters, broken at spaces.
pub fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].chars().count() + 1 + word.chars().count() > most {
            lines.push(word.to_owned());
        } else {
            let line = &mut lines[last];
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits_and_round_before_they_choose_a_form() {
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
    fn text_of_others_cannot_act() {
        assert_eq!(one_line("a\nb\u{1b}[2Jc\u{202e}d"), "a b\u{fffd}[2Jc\u{fffd}d");
    }
}
