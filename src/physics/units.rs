//! Which SI value a text such as `26.9 mm` stands for.
//!
//! Units are those of the `uom` crate, by abbreviation, singular and plural, each by its definition: the claim
//! `text/units` computes them anew. The crate itself stays out of the program: its conversions are a function for each
//! unit. Three things differ:
//!
//! - the product of number and conversion factor is taken of the decimals as written and rounded once, so that
//!   `26.9 mm` is the f64 nearest 0.0269, which `26.9 · 0.001` need not be;
//! - pound, ounce, slug, pound-force and what is made of them convert by their exact definitions (1 lb = 0.45359237 kg,
//!   1 in = 25.4 mm, g = 9.80665 m/s²); `uom` rounds them to seven digits;
//! - a power of ten is one: some prefixes of `uom` are quotients of rounded powers, and 1 µg gives 9.999999999999999e-10 kg.

use strum::VariantArray;
use thiserror::Error;

/// What a quantity of a scene is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Dimension {
    /// Mass (kg).
    Mass,
    /// Length (m).
    Length,
    /// Pressure or strength (Pa).
    Pressure,
    /// Mass density (kg/m³).
    Density,
    /// Velocity (m/s).
    Velocity,
    /// Force (N).
    Force,
    /// Stiffness, force per length (N/m).
    Stiffness,
    /// Viscosity, force per velocity (kg/s).
    Viscosity,
    /// Drag, force per velocity squared (kg/m).
    Drag,
    /// Time (s).
    Time,
    /// Energy (J); no scene has one, but its units are known ones.
    Energy,
}

/// The units, one a line: dimension, spellings, SI value.
const UNITS: &str = include_str!("units.txt");

/// A unit: a line of [`UNITS`]; an uncia is a mass and a length.
struct Unit {
    dimension: Dimension,
    spellings: &'static str,
    value: &'static str,
}

impl Unit {
    fn read(line: &'static str) -> Option<Self> {
        let mut parts = line.split('|').map(str::trim);
        let (name, spellings, value) = (parts.next()?, parts.next()?, parts.next()?);
        let dimension = Dimension::VARIANTS.iter().copied().find(|known| <&str>::from(*known) == name)?;
        Some(Self { dimension, spellings, value })
    }

    fn spellings(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.spellings.split(',').map(str::trim_start)
    }

    /// The units that have the spelling of `unit`, in the order of [`UNITS`].
    fn spelled(unit: &str) -> impl Iterator<Item = Self> {
        let name = canonical(unit);
        // A run asks for a few, and the table has hundreds: lines without the text are not read.
        let behind_a_space = format!(" {name}");
        let lines = UNITS.lines().filter(move |line| line.contains(&behind_a_space));
        lines.filter_map(Self::read).filter(move |known| known.spellings().any(|spelling| spelling == name))
    }
}

impl Dimension {
    /// Name for messages, and common units, the SI unit first.
    fn about(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Mass => ("mass", &["kg", "g", "t", "mg", "lb", "oz"]),
            Self::Length => ("length", &["m", "mm", "cm", "µm", "km", "in", "ft"]),
            Self::Pressure => ("pressure", &["Pa", "kPa", "MPa", "GPa", "bar", "psi", "ksi"]),
            Self::Density => ("mass density", &["kg/m^3", "g/cm^3", "t/m^3", "lb/ft^3", "lb/in^3"]),
            Self::Velocity => ("velocity", &["m/s", "mm/s", "km/s", "km/h", "ft/s"]),
            Self::Force => ("force", &["N", "kN", "MN", "lbf", "kgf"]),
            Self::Stiffness => ("stiffness (force per length)", &["N/m", "kN/m", "MN/m", "N/mm", "lbf/in"]),
            Self::Viscosity => ("viscosity (force per velocity)", &["kg/s", "N s/m", "g/s", "lb/s"]),
            Self::Drag => ("drag (force per velocity squared)", &["kg/m", "g/cm", "g/m", "lb/ft"]),
            Self::Time => ("time", &["s", "ms", "µs", "min"]),
            Self::Energy => ("energy", &["J", "kJ", "MJ"]),
        }
    }

    /// Name for messages: `mass`.
    pub fn noun(self) -> &'static str {
        self.about().0
    }

    /// Common units, the SI unit first.
    pub fn units(self) -> &'static [&'static str] {
        self.about().1
    }

    /// SI unit in print: `kg/m³`.
    pub fn symbol(self) -> String {
        canonical(self.units()[0])
    }

    /// SI value of one `unit`; `None` for a unit that is not of this dimension.
    pub fn coefficient(self, unit: &str) -> Option<f64> {
        let value = Unit::spelled(unit).find(|known| known.dimension == self)?.value;
        value.parse().ok()
    }

    /// Every spelling of every unit, with its dimension.
    pub fn spellings() -> impl Iterator<Item = (Self, &'static str)> {
        let known = UNITS.lines().filter_map(Unit::read);
        known.flat_map(|known| known.spellings().map(move |name| (known.dimension, name)))
    }

    /// The dimension that `unit` has, if any.
    pub fn of(unit: &str) -> Option<Self> {
        Unit::spelled(unit).next().map(|known| known.dimension)
    }
}

/// Spelling that the tables know: single spaces, `²` and `³` for `^2`, `^3` or a digit after a letter, one micro sign.
fn canonical(unit: &str) -> String {
    let words = unit.split_whitespace().collect::<Vec<_>>().join(" ").replace(" ^", "^").replace(" / ", "/");
    let mut text = String::with_capacity(words.len());
    for symbol in words.replace('^', "").chars() {
        let after_letter = text.chars().next_back().is_some_and(char::is_alphabetic);
        text.push(match symbol {
            '2' if after_letter => '²',
            '3' if after_letter => '³',
            // Greek mu, as keyboards give it, for the micro sign.
            'μ' => 'µ',
            other => other,
        });
    }
    match text.as_str() {
        "um" => "µm".to_owned(),
        "us" => "µs".to_owned(),
        _ => text,
    }
}

/// Why a text is no quantity.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum QuantityError {
    /// No number in front.
    #[error("there is no number in front of the unit")]
    NoNumber,
    /// NaN, an infinity, or beyond the largest `f64`.
    #[error("the number is not finite in 64 bits")]
    NotFinite,
    /// Not zero as written, and zero as an `f64` or below where `f64` keeps its digits.
    #[error("the number is too small for 64 bits: below 2.3e-308 its digits are lost")]
    TooSmall,
    /// A number alone.
    #[error("there is no unit")]
    NoUnit,
    /// A number that has no unit, and something behind it.
    #[error("it has no unit, and `{text}` stands behind the number")]
    Behind {
        /// The text.
        text: String,
    },
    /// A unit of another dimension.
    #[error("`{unit}` is a unit of {}", .has.noun())]
    WrongDimension {
        /// The unit.
        unit: String,
        /// What it is a unit of.
        has: Dimension,
    },
    /// No unit that is known.
    #[error("`{unit}` is no known unit")]
    UnknownUnit {
        /// The text in place of a unit.
        unit: String,
    },
}

/// Splits `text` into the number in front and what follows it; the number may be empty.
pub fn split(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = usize::from(bytes.first().is_some_and(|b| matches!(b, b'+' | b'-')));
    let start = end;
    end = digits(end);
    let mut count = end - start;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        count += fraction - end - 1;
        end = fraction;
    }
    if count == 0 {
        return ("", text);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(bytes.get(end + 1).is_some_and(|b| matches!(b, b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        // `5 eV` has no exponent: a digit has to follow.
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    text.split_at(end)
}

/// The `f64` nearest the decimal `number`.
///
/// # Errors
/// [`QuantityError::NotFinite`] for NaN, infinities and overflow; [`QuantityError::TooSmall`] for a number that is
/// not zero and would be read as zero or with fewer digits; [`QuantityError::NoNumber`] for anything else that is no number.
pub fn number(number: &str) -> Result<f64, QuantityError> {
    let value: f64 = number.parse().map_err(|_| QuantityError::NoNumber)?;
    let is_written_as_zero = || {
        let mantissa = number.split(['e', 'E']).next().unwrap_or_default();
        !mantissa.contains(|digit: char| ('1'..='9').contains(&digit))
    };
    if !value.is_finite() {
        Err(QuantityError::NotFinite)
    } else if value.abs() < f64::MIN_POSITIVE && !(value == 0.0 && is_written_as_zero()) {
        Err(QuantityError::TooSmall)
    } else {
        // Adding zero turns -0 into 0, which no formula needs to think about then.
        Ok(value + 0.0)
    }
}

/// A number beside the decimal that it was read from, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The `f64` nearest the decimal.
    pub value: f64,
    /// The decimal as written, times that of the unit: `269e-4` for `26.9 mm`. It is the exact value where that of the
    /// unit is a decimal of at most 17 digits, as for metric units; see [`quantity`] for others.
    pub decimal: String,
    /// How far off the decimal may be, over itself: zero where it is the exact value.
    pub relative_error: f64,
}

/// How far off the decimal nearest to the SI value `coefficient` of a unit may be: nothing up to 13 digits and for the
/// pound-force, which has 14 by definition; the rounding of 14 or 15 digits; that of an `f64`, and of the product, beyond.
fn error_of(coefficient: f64) -> f64 {
    let text = format!("{coefficient:e}");
    let digits: String = text.split('e').next().unwrap_or_default().chars().filter(char::is_ascii_digit).collect();
    match digits.len() {
        ..=13 => 0.0,
        _ if digits == "44482216152605" => 0.0,
        14 | 15 => 1e-13,
        _ => 4.0 * f64::EPSILON,
    }
}

impl Quantity {
    /// A bare number.
    ///
    /// # Errors
    /// As [`number`].
    pub fn bare(decimal: &str) -> Result<Self, QuantityError> {
        Ok(Self { value: number(decimal)?, decimal: decimal.to_owned(), relative_error: 0.0 })
    }

    /// A number with a unit of `dimension`.
    ///
    /// # Errors
    /// As [`quantity`].
    pub fn with_unit(text: &str, dimension: Dimension) -> Result<Self, QuantityError> {
        let (digits, unit) = number_and_unit(text)?;
        let coefficient = dimension.coefficient(unit).ok_or_else(|| match Dimension::of(unit) {
            Some(has) => QuantityError::WrongDimension { unit: unit.to_owned(), has },
            None => QuantityError::UnknownUnit { unit: unit.to_owned() },
        })?;
        let (decimal, relative_error) = product(digits, coefficient);
        Ok(Self { relative_error, ..Self::bare(&decimal)? })
    }

    /// A number with any unit, and the powers of dimensions that the unit is made of ([`compound`]).
    ///
    /// # Errors
    /// As [`quantity`].
    pub fn with_any_unit(text: &str) -> Result<(Self, Vec<(Dimension, i8)>), QuantityError> {
        let (digits, unit) = number_and_unit(text)?;
        let unknown = || QuantityError::UnknownUnit { unit: unit.to_owned() };
        let Compound { coefficient, exact, error, powers } = compounded(unit).ok_or_else(unknown)?;
        if let Some(text) = exact.and_then(|exact| exact_product(digits, exact)) {
            return Ok((Self::bare(&text)?, powers));
        }
        // The decimal of the coefficient says nothing of how far off it is.
        let (decimal, _) = product(digits, coefficient);
        let relative_error = error + 4.0 * f64::EPSILON;
        Ok((Self { relative_error, ..Self::bare(&decimal)? }, powers))
    }
}

/// The number and the unit of a text.
fn number_and_unit(text: &str) -> Result<(&str, &str), QuantityError> {
    let text = text.trim();
    let (digits, unit) = split(text);
    if digits.is_empty() {
        let word = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        let word = word.split_whitespace().next().unwrap_or_default();
        return Err(match word {
            "nan" | "inf" | "infinity" => QuantityError::NotFinite,
            _ => QuantityError::NoNumber,
        });
    }
    number(digits)?;
    let unit = unit.trim();
    if unit.is_empty() {
        return Err(QuantityError::NoUnit);
    }
    Ok((digits, unit))
}

/// SI value of one `unit`, and the powers of dimensions that it is made of: of a known unit, or of a product or quotient of
/// such, as in `Pa s`, `1/m`, `N s^2/m^2` and `kg/(m s)`.
///
/// `None` where a part is no known unit, or a power is no whole number from -9 to 9.
///
/// # Example
/// ```
/// use penetrode::physics::units::{Dimension, compound};
/// assert_eq!(compound("kN/mm^2"), Some((1e9, vec![(Dimension::Force, 1), (Dimension::Length, -2)])));
/// assert_eq!(compound("1/ms"), Some((1e3, vec![(Dimension::Time, -1)])));
/// ```
pub fn compound(unit: &str) -> Option<(f64, Vec<(Dimension, i8)>)> {
    compounded(unit).map(|compound| (compound.coefficient, compound.powers))
}

/// A unit made of others.
struct Compound {
    coefficient: f64,
    /// Signed digits and power of ten of the coefficient, where it is known exactly.
    exact: Option<(i128, i64)>,
    /// How far off the coefficient may be, over itself.
    error: f64,
    powers: Vec<(Dimension, i8)>,
}

/// The exact coefficient of one unit to a `power`; of a quotient only by a power of ten.
fn exact_power(coefficient: f64, power: i8) -> Option<(i128, i64)> {
    let (mut digits, mut exponent) = decimal(&format!("{coefficient:e}")).filter(|_| error_of(coefficient) == 0.0)?;
    while digits % 10 == 0 && digits != 0 {
        (digits, exponent) = (digits / 10, exponent + 1);
    }
    let count = u32::try_from(power).ok().or_else(|| (digits == 1).then_some(0))?;
    Some((digits.checked_pow(count)?, exponent * i64::from(power)))
}

fn compounded(unit: &str) -> Option<Compound> {
    if let Some(dimension) = Dimension::of(unit) {
        let coefficient = dimension.coefficient(unit)?;
        let exact = exact_power(coefficient, 1);
        return Some(Compound { coefficient, exact, error: error_of(coefficient), powers: vec![(dimension, 1)] });
    }
    let (mut coefficient, mut powers) = (1.0, Vec::new());
    let (mut exact, mut error) = (Some((1_i128, 0_i64)), 0.0);
    for (index, part) in unit.split('/').enumerate() {
        let part = part.trim();
        let inner = part.strip_prefix('(').and_then(|part| part.strip_suffix(')')).unwrap_or(part);
        let is_one = index == 0 && inner == "1";
        for factor in inner.split([' ', '*', '·']).filter(|factor| !factor.is_empty() && !is_one) {
            let base = factor.trim_end_matches(|symbol: char| symbol.is_ascii_digit() || "^-²³".contains(symbol));
            let power = match factor[base.len()..].trim_start_matches('^') {
                "" => 1,
                "²" => 2,
                "³" => 3,
                digits => digits.parse::<i8>().ok().filter(|power| (-9..=9).contains(power))?,
            };
            let (dimension, power) = (Dimension::of(base)?, if index == 0 { power } else { -power });
            let one = dimension.coefficient(base)?;
            coefficient *= one.powi(i32::from(power));
            // Each factor as far off as it is, and the roundings of its products.
            error += f64::from(power.unsigned_abs()) * (error_of(one) + 2.0 * f64::EPSILON) + 2.0 * f64::EPSILON;
            exact = exact
                .zip(exact_power(one, power))
                .and_then(|((digits, exponent), (more, shift))| Some((digits.checked_mul(more)?, exponent + shift)));
            powers.push((dimension, power));
        }
    }
    (!powers.is_empty() && coefficient.is_normal()).then_some(Compound { coefficient, exact, error, powers })
}

/// SI value of a text `number unit`, of `dimension`. White space around and between is free, and may be absent.
///
/// # Errors
/// [`QuantityError`]: what is wrong with the text.
///
/// # Accuracy
/// Correctly rounded where the SI value of the unit is a decimal of at most 17 digits, as it is for metric units;
/// within 1 ulp else (units such as psi, whose value is itself rounded to `f64`).
///
/// # Example
/// ```
/// use penetrode::physics::units::{Dimension, quantity};
/// assert_eq!(quantity("26.9 mm", Dimension::Length), Ok(0.0269));
/// assert_eq!(quantity("36MPa", Dimension::Pressure), Ok(36e6));
/// ```
pub fn quantity(text: &str, dimension: Dimension) -> Result<f64, QuantityError> {
    Quantity::with_unit(text, dimension).map(|quantity| quantity.value)
}

/// The bare decimal `digits` in a unit of which `coefficient` is the SI value, as accurate as [`quantity`]; for a column of
/// numbers, whose unit is looked up once.
///
/// # Errors
/// As [`number`].
pub fn scaled(digits: &str, coefficient: f64) -> Result<f64, QuantityError> {
    number(digits)?;
    number(&product(digits, coefficient).0)
}

/// Decimal text of `number · coefficient`, and how far off it may be, over itself.
fn product(number: &str, coefficient: f64) -> (String, f64) {
    let exact = decimal(&format!("{coefficient:e}")).and_then(|coefficient| exact_product(number, coefficient));
    // Beyond 38 digits the last ones do not matter: two roundings more.
    if let Some(text) = exact {
        return (text, error_of(coefficient));
    }
    let rounded = number.parse().unwrap_or(f64::NAN) * coefficient;
    (format!("{rounded:e}"), error_of(coefficient) + 4.0 * f64::EPSILON)
}

/// Decimal text of `number` times digits and a power of ten; `None` beyond 38 digits.
fn exact_product(number: &str, (digits, exponent): (i128, i64)) -> Option<String> {
    let (left, left_exponent) = decimal(number)?;
    Some(format!("{}e{}", left.checked_mul(digits)?, left_exponent.checked_add(exponent)?))
}

/// Signed digits and power of ten of a decimal.
pub(crate) fn decimal(text: &str) -> Option<(i128, i64)> {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let exponent: i64 = exponent.parse().ok()?;
    Some((format!("{whole}{fraction}").parse().ok()?, exponent.checked_sub(i64::try_from(fraction.len()).ok()?)?))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn every_common_unit_of_every_dimension_is_known_and_of_that_dimension_alone() {
        for &dimension in Dimension::VARIANTS {
            assert_eq!(dimension.coefficient(dimension.units()[0]), Some(1.0), "{dimension:?}");
            for unit in dimension.units() {
                assert!(quantity(&format!("1 {unit}"), dimension).is_ok(), "{unit}");
                assert_eq!(Dimension::of(unit), Some(dimension), "{unit}");
            }
        }
        for line in UNITS.lines() {
            let [dimension, names, value] = line.split(" | ").collect::<Vec<_>>()[..] else { panic!("{line}") };
            let dimension = Dimension::VARIANTS.iter().find(|known| <&str>::from(*known) == dimension).unwrap();
            for name in names.split(", ") {
                assert_eq!(quantity(&format!("1 {name}"), *dimension), Ok(value.parse().unwrap()), "{name}");
            }
        }
    }

    #[test]
    fn conversions_are_the_nearest_f64_of_the_decimal() {
        for (text, dimension, value) in [
            ("26.9 mm", Dimension::Length, 0.0269),
            ("0.0269 m", Dimension::Length, 0.0269),
            ("2.69cm", Dimension::Length, 0.0269),
            ("7 µm", Dimension::Length, 7e-6),
            ("7 um", Dimension::Length, 7e-6),
            ("7 \u{3bc}m", Dimension::Length, 7e-6),
            ("1.3 km", Dimension::Length, 1300.0),
            ("0.1 in", Dimension::Length, 0.00254),
            ("0.7 ft", Dimension::Length, 0.213_36),
            ("36 MPa", Dimension::Pressure, 36e6),
            ("35.2 MPa", Dimension::Pressure, 35.2e6),
            ("0.0363 GPa", Dimension::Pressure, 36.3e6),
            ("41.1 kPa", Dimension::Pressure, 41_100.0),
            ("36.3 N/mm²", Dimension::Pressure, 36.3e6),
            ("36.3 N/mm^2", Dimension::Pressure, 36.3e6),
            ("906 g", Dimension::Mass, 0.906),
            ("64.9 mg", Dimension::Mass, 64.9e-6),
            ("2.27 t", Dimension::Mass, 2270.0),
            ("2.37 g/cm3", Dimension::Density, 2370.0),
            ("2.37 g/cm³", Dimension::Density, 2370.0),
            ("2300 kg/m^3", Dimension::Density, 2300.0),
            ("2300 kg/m3", Dimension::Density, 2300.0),
            ("2300 kg/m³", Dimension::Density, 2300.0),
            ("2300 kg / m ^3", Dimension::Density, 2300.0),
            ("0.277 km/s", Dimension::Velocity, 277.0),
            ("1000.5 ft/s", Dimension::Velocity, 304.9524),
            ("8.48e3 kN/m", Dimension::Stiffness, 8.48e6),
            ("-10 N", Dimension::Force, -10.0),
            ("+0.0103 MN", Dimension::Force, 10_300.0),
            ("1e3 kg/s", Dimension::Viscosity, 1e3),
            ("1.1 kN s/m", Dimension::Viscosity, 1.1e3),
            (".5 kg/m", Dimension::Drag, 0.5),
            ("5. g/cm", Dimension::Drag, 0.5),
            ("  3 \u{a0} µs ", Dimension::Time, 3e-6),
            ("3 us", Dimension::Time, 3e-6),
            // The f64 product of either with 0.001 is another number.
            ("0.9 mm", Dimension::Length, 0.0009),
            ("1.3e0 mm", Dimension::Length, 0.0013),
            // Digits that are no exponents.
            ("2 in Hg (32 °F)", Dimension::Pressure, 6772.76),
        ] {
            assert_eq!(quantity(text, dimension), Ok(value), "{text}");
        }
    }

    #[test]
    fn customary_units_follow_their_exact_definitions() {
        let (pound, foot, inch, gravity) = (0.453_592_37_f64, 0.3048_f64, 0.0254_f64, 9.806_65_f64);
        let pound_force = pound * gravity;
        for (unit, dimension, value) in [
            ("oz", Dimension::Mass, pound / 16.0),
            ("slug", Dimension::Mass, pound_force / foot),
            ("lbf", Dimension::Force, pound_force),
            ("kip", Dimension::Force, 1e3 * pound_force),
            ("psi", Dimension::Pressure, pound_force / (inch * inch)),
            ("ksi", Dimension::Pressure, 1e3 * pound_force / (inch * inch)),
            ("psf", Dimension::Pressure, pound_force / (foot * foot)),
            ("lb/ft3", Dimension::Density, pound / foot.powi(3)),
            ("lb/in3", Dimension::Density, pound / inch.powi(3)),
            ("slug/ft3", Dimension::Density, pound_force / foot.powi(4)),
            ("lbf/in", Dimension::Stiffness, pound_force / inch),
            ("lbf/ft", Dimension::Stiffness, pound_force / foot),
            ("lb/s", Dimension::Viscosity, pound),
            ("slug/s", Dimension::Viscosity, pound_force / foot),
            ("lb/ft", Dimension::Drag, pound / foot),
            ("lb/in", Dimension::Drag, pound / inch),
            ("slug/ft", Dimension::Drag, pound_force / (foot * foot)),
        ] {
            approx::assert_relative_eq!(dimension.coefficient(unit).unwrap_or(f64::NAN), value, max_relative = 5e-16);
        }
    }

    #[test]
    fn texts_that_are_no_quantity_say_why() {
        let refused = |text: &str| quantity(text, Dimension::Length).map_err(|error| error.to_string());
        for (text, message) in [
            ("", "there is no number in front of the unit"),
            ("mm", "there is no number in front of the unit"),
            (". mm", "there is no number in front of the unit"),
            ("nan mm", "the number is not finite in 64 bits"),
            ("-inf mm", "the number is not finite in 64 bits"),
            ("1e400 mm", "the number is not finite in 64 bits"),
            ("1e308 km", "the number is not finite in 64 bits"),
            ("1e-400 m", "the number is too small for 64 bits: below 2.3e-308 its digits are lost"),
            ("1e-323 mm", "the number is too small for 64 bits: below 2.3e-308 its digits are lost"),
            ("5", "there is no unit"),
            ("5 kg", "`kg` is a unit of mass"),
            ("5 s", "`s` is a unit of time"),
            ("5 J", "`J` is a unit of energy"),
            ("5 furlong", "`furlong` is no known unit"),
            ("5 eV", "`eV` is a unit of energy"),
            ("1,5 mm", "`,5 mm` is no known unit"),
            ("5 mm mm", "`mm mm` is no known unit"),
        ] {
            assert_eq!(refused(text), Err(message.to_owned()), "{text}");
        }
    }

    #[test]
    fn zero_and_many_digits_are_read() {
        assert_eq!(quantity("0.000e-999 m", Dimension::Length), Ok(0.0));
        assert!(quantity("-0 m", Dimension::Length).is_ok_and(f64::is_sign_positive));
        let many = format!("0.{}m", "3".repeat(500));
        assert_eq!(quantity(&many, Dimension::Length), Ok(1.0 / 3.0));
        assert!(number("-0.0").is_ok_and(f64::is_sign_positive));
        // 30 digits by 16 of the factor do not fit 38.
        let wide = quantity("0.123456789012345678901234567890 psi", Dimension::Pressure);
        approx::assert_relative_eq!(wide.unwrap_or(f64::NAN), 0.123_456_789_012_345_68 * 6_894.757_293_168_361);
    }

    #[test]
    fn a_number_ends_where_no_exponent_follows_and_has_a_digit() {
        for (text, number) in [
            ("5 eV", "5"),
            ("5e", "5"),
            ("5e-3mm", "5e-3"),
            ("-.5e+3", "-.5e+3"),
            ("5e- mm", "5"),
            (".5mm", ".5"),
            ("-5.mm", "-5."),
        ] {
            assert_eq!(split(text), (number, &text[number.len()..]), "{text}");
        }
        for text in ["e5", ".", ". mm", "-.", "+.mm", ".e5"] {
            assert_eq!(split(text), ("", text));
        }
    }
}
