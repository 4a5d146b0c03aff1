//! Many scenes from a table: what each row asks, and what each is answered (contract, "Tables").
//!
//! A row is one crater and one tunnel. Its result depends on no other row, so that threads and neighbours change
//! nothing.

use csv::{ByteRecord, StringRecord};
use thiserror::Error;

use super::critical_velocity;
use crate::integrators::{Detail, Flight, Integrator};
use crate::physics::{Concrete, CraterStiffness, Criterion, Outcome, Resistance, Scene, semi_empirical};

/// Columns that a table may have, in the order of the contract.
pub const COLUMNS: [&str; 12] = [
    "mass_kg",
    "diameter_m",
    "nose_factor",
    "strength_pa",
    "density_kg_m3",
    "thickness_m",
    "S",
    "B",
    "k",
    "crater_stiffness_n_m",
    "velocity_m_s",
    "criterion",
];

/// Columns that may be left out, or left empty in a row.
const OPTIONAL: [&str; 6] = ["thickness_m", "S", "B", "k", "crater_stiffness_n_m", "criterion"];

/// Columns of the results.
pub const RESULT_HEADER: &str = "row,outcome,depth_m,time_s,velocity_m_s,crater_end_time_s,crater_end_velocity_m_s,\
                                 exit_margin,critical_velocity_m_s,error";

/// Why a table cannot be used at all.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum HeaderError {
    /// A name that is no column.
    #[error("there is no column `{name}` (column {column} of the first line)")]
    Unknown {
        /// Name found.
        name: String,
        /// Place from 1.
        column: usize,
    },
    /// A column twice.
    #[error("the column `{name}` stands twice (column {column} of the first line)")]
    Twice {
        /// Name found.
        name: String,
        /// Place from 1.
        column: usize,
    },
    /// A column that every scene needs.
    #[error("the column `{name}` is missing")]
    Missing {
        /// Its name.
        name: &'static str,
    },
}

/// Where each column of [`COLUMNS`] stands in the table at hand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    places: [Option<usize>; COLUMNS.len()],
    width: usize,
}

impl Layout {
    /// The layout that `header` describes.
    ///
    /// # Errors
    /// [`HeaderError`]: an unknown, doubled or missing column.
    pub fn new(header: &StringRecord) -> Result<Self, HeaderError> {
        let mut places = [None; COLUMNS.len()];
        for (place, name) in header.iter().enumerate() {
            let name = name.trim();
            let column = place + 1;
            let index = COLUMNS
                .iter()
                .position(|known| *known == name)
                .ok_or_else(|| HeaderError::Unknown { name: name.to_owned(), column })?;
            if places[index].replace(place).is_some() {
                return Err(HeaderError::Twice { name: name.to_owned(), column });
            }
        }
        for (index, name) in COLUMNS.into_iter().enumerate() {
            if places[index].is_none() && !OPTIONAL.contains(&name) {
                return Err(HeaderError::Missing { name });
            }
        }
        Ok(Self { places, width: header.len() })
    }

    /// The scene of `row`.
    ///
    /// # Errors
    /// What is wrong, with the column.
    pub fn scene(&self, row: &ByteRecord) -> Result<Scene, String> {
        if row.len() != self.width {
            return Err(format!("{} cells in a table of {} columns", row.len(), self.width));
        }
        let cell = |index: usize| -> Result<&str, String> {
            let Some(place) = self.places[index] else { return Ok("") };
            std::str::from_utf8(row.get(place).unwrap_or_default())
                .map(str::trim)
                .map_err(|_| format!("{}: not UTF-8 text", COLUMNS[index]))
        };
        let number = |index: usize| -> Result<Option<f64>, String> {
            let text = cell(index)?;
            if text.is_empty() {
                return if OPTIONAL.contains(&COLUMNS[index]) {
                    Ok(None)
                } else {
                    Err(format!("{}: empty, and every scene needs it", COLUMNS[index]))
                };
            }
            let value: f64 = text.parse().map_err(|_| format!("{}: `{text}` is not a number", COLUMNS[index]))?;
            if value.is_finite() { Ok(Some(value)) } else { Err(format!("{}: {text} is not finite", COLUMNS[index])) }
        };
        let needed = |index: usize| number(index).map(Option::unwrap_or_default);
        let strength = needed(3)?;
        Ok(Scene {
            title: None,
            mass: needed(0)?,
            resistance: Resistance::Concrete(Concrete {
                diameter: needed(1)?,
                nose_factor: needed(2)?,
                strength,
                density: needed(4)?,
                static_factor: number(6)?.unwrap_or_else(|| semi_empirical::static_factor(strength)),
                inertia_factor: number(7)?.unwrap_or(1.0),
                crater_ratio: number(8)?.unwrap_or(2.0),
                crater_stiffness: number(9)?.map_or(CraterStiffness::Continuous, CraterStiffness::Given),
                layers: Vec::new(),
            }),
            thickness: number(5)?,
            criterion: match cell(11)? {
                "" | "full-depth" => Criterion::FullDepth,
                "ndrc" => Criterion::Ndrc,
                other => return Err(format!("criterion: `{other}` is not full-depth or ndrc")),
            },
            velocity: Some(needed(10)?),
        })
    }
}

/// What a row is answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The flight.
    pub flight: Flight,
    /// Critical velocity [m/s], where it was asked for and the target has a thickness.
    pub critical_velocity: Option<f64>,
}

/// Flies `scene` by `method`, and finds its critical velocity if `with_critical` and it has a thickness.
///
/// # Errors
/// What is wrong with the row, or what could not be computed.
pub fn answer(scene: &Scene, method: &dyn Integrator, with_critical: bool) -> Result<Answer, String> {
    let problem = scene.problem().map_err(|error| error.to_string())?;
    let flight = method.fly(&problem, Detail::Events).map_err(|error| error.to_string())?;
    let critical_velocity = if with_critical && scene.thickness.is_some() {
        let found = critical_velocity::of_scene(scene, method).map_err(|error| error.to_string())?;
        Some(found.velocity)
    } else {
        None
    };
    Ok(Answer { flight, critical_velocity })
}

/// One line of results, without its end: `row` counts from 1.
pub fn result_line(row: u64, answer: &Result<Answer, String>) -> String {
    match answer {
        Ok(Answer { flight, critical_velocity }) => {
            let number = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
            let crater_end = flight.crater_end();
            format!(
                "{row},{},{},{},{},{},{},{},{},",
                flight.outcome,
                flight.end.depth,
                flight.end.time,
                flight.end.velocity,
                number(crater_end.map(|s| s.time)),
                number(crater_end.map(|s| s.velocity)),
                number(flight.exit_margin),
                number(*critical_velocity),
            )
        }
        Err(message) => format!("{row},,,,,,,,,{}", quoted(message)),
    }
}

/// A message as one CSV cell.
fn quoted(message: &str) -> String {
    let line: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("\"{}\"", line.replace('"', "\"\""))
}

/// Whether a row is undecided.
pub fn is_undecided(answer: &Result<Answer, String>) -> bool {
    matches!(answer, Ok(answer) if answer.flight.outcome == Outcome::Undecided)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;
    use crate::integrators::Taylor;

    const HEADER: [&str; 7] =
        ["velocity_m_s", "mass_kg", "diameter_m", "nose_factor", "strength_pa", "density_kg_m3", "S"];

    fn layout() -> Layout {
        Layout::new(&StringRecord::from(HEADER.to_vec())).unwrap()
    }

    #[test]
    fn columns_come_in_any_order_and_defaults_fill_the_rest() {
        let row = ByteRecord::from(vec!["300", "2", "0.05", "0.72", "36e6", "2300", ""]);
        let scene = layout().scene(&row).unwrap();
        let concrete = scene.concrete().unwrap();
        assert_eq!((scene.mass, scene.velocity, scene.thickness), (2.0, Some(300.0), None));
        // Eq. 14: 72/sqrt(36).
        assert_eq!((concrete.static_factor, concrete.inertia_factor, concrete.crater_ratio), (12.0, 1.0, 2.0));
        let answer = answer(&scene, &Taylor::default(), true).unwrap();
        assert!((answer.flight.end.depth - 0.144_826_200_112_217_07).abs() < 1e-15);
        assert_eq!(answer.critical_velocity, None);
    }

    #[test]
    fn a_bad_row_names_its_column_and_stops_nothing() {
        for (row, expected) in [
            (vec!["300", "2", "0.05", "0.72", "36e6", "2300"], "6 cells in a table of 7 columns"),
            (vec!["300", "two", "0.05", "0.72", "36e6", "2300", ""], "mass_kg: `two` is not a number"),
            (vec!["nan", "2", "0.05", "0.72", "36e6", "2300", ""], "velocity_m_s: nan is not finite"),
            (vec!["", "2", "0.05", "0.72", "36e6", "2300", ""], "velocity_m_s: empty, and every scene needs it"),
        ] {
            let message = layout().scene(&ByteRecord::from(row)).unwrap_err();
            assert_eq!(message, expected);
            assert_eq!(result_line(3, &Err(message)), format!("3,,,,,,,,,\"{expected}\""));
        }
        let negative =
            layout().scene(&ByteRecord::from(vec!["300", "-2", "0.05", "0.72", "36e6", "2300", ""])).unwrap();
        assert!(answer(&negative, &Taylor::default(), false).unwrap_err().contains("mass"));
    }

    #[test]
    fn a_header_with_an_unknown_doubled_or_missing_column_is_refused() {
        let header = |names: &[&str]| Layout::new(&StringRecord::from(names.to_vec())).unwrap_err();
        assert!(matches!(header(&["mass"]), HeaderError::Unknown { column: 1, .. }));
        assert!(matches!(header(&["mass_kg", "mass_kg"]), HeaderError::Twice { column: 2, .. }));
        assert!(matches!(header(&["mass_kg"]), HeaderError::Missing { name: "diameter_m" }));
    }

    #[test]
    fn a_message_is_one_cell_whatever_it_quotes() {
        assert_eq!(quoted("a \"b\"\nc"), "\"a \"\"b\"\" c\"");
    }
}
