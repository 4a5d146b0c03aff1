//! How is a number shown in a message?
//!
//! `Display` of f64 writes 1e300 with 301 digits. [`Shown`] is the shortest text that reads back to the same number.

use std::fmt;

/// A number in a message: plain from 1e-5 up to 1e16, scientific beyond; it reads back to the same f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown(pub f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = *self;
        if value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs()) {
            write!(f, "{value}")
        } else {
            write!(f, "{value:e}")
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a text that is no number is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_short_and_reads_back() {
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
}
