//! What a column of a table holds, by its name and the unit in it.

use serde::Serialize;

use crate::exchange::tables::{Column as Known, Format, Need, Others, spellings, unit_of};
use crate::physics::units::Dimension;
use crate::studies::quantity::Quantity;

/// A table of results over the step size, the quantities in the order of [`Quantity::ALL`] behind the step.
pub static RESULTS: Format = Format {
    columns: &[
        Known::number("dt_s"),
        Known::number("depth_m").needed(Need::Optional),
        Known::number("time_s").needed(Need::Optional),
        Known::number("velocity_m_s").needed(Need::Optional),
        Known::number("crater_end_time_s").needed(Need::Optional),
        Known::number("crater_end_velocity_m_s").needed(Need::Optional),
        Known::number("critical_velocity_m_s").needed(Need::Optional),
    ],
    others: Others::Read,
    has_comments: true,
};

/// Name without unit, dimension and meaning of each column of [`RESULTS`]; `None` for the step.
const KNOWN: [(&str, Dimension, Option<Quantity>); 7] = [
    ("dt", Dimension::Time, None),
    ("depth", Dimension::Length, Some(Quantity::Depth)),
    ("time", Dimension::Time, Some(Quantity::Time)),
    ("velocity", Dimension::Velocity, Some(Quantity::Velocity)),
    ("crater_end_time", Dimension::Time, Some(Quantity::CraterEndTime)),
    ("crater_end_velocity", Dimension::Velocity, Some(Quantity::CraterEndVelocity)),
    ("critical_velocity", Dimension::Velocity, Some(Quantity::CriticalVelocity)),
];

/// Longest name of a column (bytes): a name is no sentence.
const NAME_MAX: usize = 64;

/// What a column of results is: a quantity of the scene, or anything else, by its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Column {
    /// A quantity that a scene gives exactly, in SI units.
    Quantity(Quantity),
    /// A number of which only the other code knows, such as `peak_force_kn`, as it stands in the table.
    Other(Box<str>),
}

impl Default for Column {
    fn default() -> Self {
        Self::Quantity(Quantity::default())
    }
}

impl Column {
    /// Name in JSON and in texts; that of another column is as its table has it.
    pub fn name(&self) -> &str {
        match self {
            Self::Quantity(quantity) => quantity.name(),
            Self::Other(name) => name,
        }
    }

    /// The quantity, if a scene knows it.
    pub fn quantity(&self) -> Option<Quantity> {
        match self {
            Self::Quantity(quantity) => Some(*quantity),
            Self::Other(_) => None,
        }
    }

    /// Name with its SI unit, as in [`RESULTS`]; that of another column as it stands.
    pub(super) fn with_unit(&self) -> String {
        match self {
            Self::Quantity(quantity) => RESULTS.columns[*quantity as usize + 1].name.to_owned(),
            Self::Other(name) => name.to_string(),
        }
    }
}

/// What the name of a column says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Heading {
    /// The name as it stands.
    pub(super) name: String,
    /// `None` for the step.
    pub(super) column: Option<Column>,
    /// Unit of the cells, where it is not the SI unit.
    pub(super) unit: Option<(Dimension, String)>,
}

impl Heading {
    /// Reads a name: a column of [`RESULTS`], the same with another unit (`depth_mm`, `depth (mm)`), or any other.
    ///
    /// # Errors
    /// For a name that may be a known one written wrongly, or no name at all: a result taken for another number would
    /// not be compared with its exact value. Gives the column that is meant, if one is.
    pub(super) fn read(name: &str) -> Result<Self, Option<&'static str>> {
        let heading = |column, unit| Ok(Self { name: name.to_owned(), column, unit });
        let of_known = |index: usize| KNOWN[index].2.map(Column::Quantity);
        if let Some(index) = RESULTS.columns.iter().position(|known| known.name == name) {
            return heading(of_known(index), None);
        }
        let lower = name.to_lowercase();
        for (index, &(stem, dimension, _)) in KNOWN.iter().enumerate() {
            let Some(rest) = lower.strip_prefix(stem).and_then(|_| name.get(stem.len()..)) else { continue };
            let Some(unit) = unit_of(rest) else { continue };
            let near = Some(RESULTS.columns[index].name);
            if let Some(unit) = spellings(unit).into_iter().find(|unit| dimension.coefficient(unit).is_some()) {
                return heading(of_known(index), Some((dimension, unit)));
            }
            // `depth` lacks its unit, `depth_kg` has a wrong one; `depth_at_peak_m` is something else.
            if !unit.contains(['_', ' ']) || spellings(unit).iter().any(|unit| Dimension::of(unit).is_some()) {
                return Err(near);
            }
        }
        if let Some(near) = resembled(&lower) {
            return Err(Some(near));
        }
        let is_word = |c: char| c.is_alphanumeric() || "_ ()[]/.%^*+-²³°".contains(c);
        let is_name = name.chars().any(char::is_alphabetic) && name.chars().all(is_word) && name.len() <= NAME_MAX;
        if is_name && name.parse::<f64>().is_err() {
            heading(Some(Column::Other(name.into())), None)
        } else {
            Err(None)
        }
    }
}

/// The column of [`RESULTS`] that a name in lower case differs from by a slip or two, in front of its unit or as a whole.
fn resembled(lower: &str) -> Option<&'static str> {
    // What begins with the very word has been looked at.
    let is_slip = |word: &str, known: &str| {
        let most = if known.len() <= 5 { 1 } else { 2 };
        (1..=most).contains(&strsim::damerau_levenshtein(word, known))
    };
    let stem =
        |known: &str| lower.match_indices('_').any(|(end, _)| is_slip(&lower[..end], known)) || is_slip(lower, known);
    let found =
        KNOWN.iter().zip(RESULTS.columns).find(|((known, ..), column)| stem(known) || is_slip(lower, column.name));
    found.map(|(_, column)| column.name)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
    use super::*;

    #[test]
    fn a_known_column_may_have_any_unit_of_its_dimension() {
        for (name, column, unit) in [
            ("dt_us", None, "us"),
            ("dt (ms)", None, "ms"),
            ("depth_mm", Some(Quantity::Depth), "mm"),
            ("Depth [in]", Some(Quantity::Depth), "in"),
            ("time_ms", Some(Quantity::Time), "ms"),
            ("velocity_km_s", Some(Quantity::Velocity), "km/s"),
            ("velocity_mm_ms", Some(Quantity::Velocity), "mm/ms"),
            ("velocity (ft/s)", Some(Quantity::Velocity), "ft/s"),
            ("crater_end_time_us", Some(Quantity::CraterEndTime), "us"),
            ("crater_end_velocity_m_per_s", Some(Quantity::CraterEndVelocity), "m/s"),
            ("critical_velocity_km_h", Some(Quantity::CriticalVelocity), "km/h"),
        ] {
            let heading = Heading::read(name).unwrap();
            assert_eq!(heading.column, column.map(Column::Quantity), "{name}");
            assert_eq!(heading.unit.unwrap().1, unit, "{name}");
        }
        assert_eq!(Heading::read("depth_m").unwrap().unit, None);
    }

    #[test]
    fn any_other_name_is_a_column_of_its_own_unless_it_may_be_a_known_one_written_wrongly() {
        for name in ["peak_force_kn", "energy_j", "Peak force (kN)", "depth_at_peak_force_m", "U3", "length_m", "RF3"] {
            assert_eq!(Heading::read(name).unwrap().column, Some(Column::Other(name.into())), "{name}");
        }
        for (name, near) in [
            ("dephts_m", Some("depth_m")),
            ("depht_mm", Some("depth_m")),
            ("depth", Some("depth_m")),
            ("depth_kg", Some("depth_m")),
            ("depth_max", Some("depth_m")),
            ("velocity_m_s2", Some("velocity_m_s")),
            ("velocty_km_s", Some("velocity_m_s")),
            ("crater_end_tme_s", Some("crater_end_time_s")),
            ("t_s", Some("dt_s")),
            ("DT", Some("dt_s")),
            ("", None),
            ("12", None),
            ("1e-6", None),
            ("force;energy", None),
            ("a\tb", None),
        ] {
            assert_eq!(Heading::read(name), Err(near), "{name}");
        }
        assert_eq!(Heading::read(&"force".repeat(13)), Err(None));
    }
}
