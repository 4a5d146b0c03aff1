//! `audit --run`: a table from the histories that another code printed.

use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use crate::exchange::input;
use crate::physics::units::{Dimension, number, quantity};
use crate::studies::audit::{Axis, Reading, Run, Table};

/// Largest history that is read (bytes).
const SIZE_MAX: u64 = 256 << 20;

/// Runs in place of a table, and how their files are read.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// A run of Abaqus or LS-DYNA and its step; repeatable.
    ///
    /// In place of a table: an X-Y report of Abaqus/CAE with the curves U1 and V1 (or 2, 3) of the projectile, or rbdout or
    /// nodout of LS-DYNA. A run ends where its depth reaches the thickness of the scene or of --thickness, else where it
    /// comes to rest, interpolated between two lines.
    #[arg(long = "run", value_name = "FILE=DT", value_parser = run)]
    pub runs: Vec<(PathBuf, f64)>,
    /// Thickness in place of a scene: 0.18 (m) or 180mm.
    #[arg(long, value_name = "H", requires = "runs", conflicts_with = "scene", value_parser = length)]
    pub thickness: Option<f64>,
    /// Units of length and time in the files.
    #[arg(long, value_name = "LENGTH,TIME", default_value = "m,s", value_parser = units)]
    pub units: (f64, f64),
    /// Axis of the flight.
    ///
    /// Without it that of the largest velocity in the first line.
    #[arg(long, requires = "runs")]
    pub axis: Option<Axis>,
    /// Number of the body or node, of several.
    #[arg(long, value_name = "N", requires = "runs")]
    pub id: Option<u64>,
}

impl RunArgs {
    /// The table of the ends of all runs; `exit_depth` (m) is that of the scene, if there is one.
    ///
    /// # Errors
    /// For a file that cannot be read, and as [`Table::of_runs`].
    pub fn table(&self, exit_depth: Option<f64>) -> Result<Table, CliError> {
        let (length, time) = self.units;
        let thickness = exit_depth.or(self.thickness).unwrap_or(f64::INFINITY);
        let reading = Reading { axis: self.axis, id: self.id, length, time, thickness };
        let read =
            |(path, step): &(PathBuf, f64)| Ok(Run { file: input::name_of(path), step: *step, text: text(path)? });
        let runs = self.runs.iter().map(read).collect::<Result<Vec<_>, CliError>>()?;
        Ok(Table::of_runs(&runs, &reading)?)
    }
}

fn text(path: &Path) -> Result<String, CliError> {
    let unread = |error| CliError::usage(format!("{}: {error}", input::name_of(path)), "name a file that can be read");
    let bytes = input::read(path, SIZE_MAX).map_err(unread)?;
    // What is no text has none of the lines that are sought.
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// A positive number, with or without a unit; without it the SI unit.
fn positive(text: &str, dimension: Dimension) -> Result<f64, String> {
    let value = number(text).or_else(|_| quantity(text, dimension)).map_err(|error| error.to_string())?;
    if value > 0.0 { Ok(value) } else { Err("not above zero".to_owned()) }
}

fn length(text: &str) -> Result<f64, String> {
    positive(text, Dimension::Length)
}

/// `FILE=DT`; a name may hold `=` too.
fn run(text: &str) -> Result<(PathBuf, f64), String> {
    let (path, step) = text.rsplit_once('=').ok_or("give the step behind the name: FILE=1e-6 or FILE=1us")?;
    if path.is_empty() {
        Err("the name of the file is missing".to_owned())
    } else {
        Ok((path.into(), positive(step, Dimension::Time)?))
    }
}

/// One unit of length and one of time (m, s).
fn units(text: &str) -> Result<(f64, f64), String> {
    let (length, time) = text.split_once(',').ok_or("give two, such as mm,ms")?;
    let one = |unit: &str, dimension: Dimension| {
        let none = || format!("`{unit}` is no unit of {}: {}", dimension.noun(), dimension.units().join(", "));
        dimension.coefficient(unit.trim()).ok_or_else(none)
    };
    Ok((one(length, Dimension::Length)?, one(time, Dimension::Time)?))
}
