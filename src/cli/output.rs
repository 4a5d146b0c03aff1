//! How results leave the program: JSON, numbers for people, tables, and files written whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::CliError;

/// Prints `value` as pretty JSON on standard output.
///
/// # Errors
/// When standard output cannot be written; a closed pipe is not an error.
pub fn print_json<T: Serialize>(value: &T) -> io::Result<()> {
    let mut text = serde_json::to_string_pretty(value).map_err(io::Error::other)?;
    text.push('\n');
    print_text(&text)
}

/// Prints `text` on standard output; a reader that has gone away (`| head`) is not an error.
///
/// # Errors
/// When standard output cannot be written for another reason.
pub fn print_text(text: &str) -> io::Result<()> {
    match io::stdout().lock().write_all(text.as_bytes()).and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// Writes `bytes` to `path` whole or not at all: into a temporary file beside it, moved into place.
///
/// # Errors
/// When the folder cannot be written or the disk is full; the old file is then untouched.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = temporary_beside(path)?;
    file.write_all(bytes)?;
    persist(file, path)
}

/// A temporary file in the folder of `path`, to be moved there by [`persist`].
///
/// # Errors
/// When the folder cannot be written, or `path` names a folder.
pub fn temporary_beside(path: &Path) -> io::Result<tempfile::NamedTempFile> {
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder; name a file"));
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    tempfile::Builder::new().prefix(".penetrode-").tempfile_in(folder)
}

/// Moves a finished temporary file to `path`, with the permissions that an ordinary new file has.
///
/// # Errors
/// When the disk is full or the move fails.
pub fn persist(file: tempfile::NamedTempFile, path: &Path) -> io::Result<()> {
    file.as_file().sync_all()?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // A temporary file is private; a result is for everybody whom the old one was for.
        let mode = fs::metadata(path).map_or(0o644, |m| m.permissions().mode());
        fs::set_permissions(file.path(), fs::Permissions::from_mode(mode))?;
    }
    file.persist(path).map(|_| ()).map_err(|e| e.error)
}

/// Whether the table at `path` is a Parquet table, by its name.
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"))
}

/// Refuses a Parquet table in a build that does without them (exit 2).
///
/// # Errors
/// As said.
pub fn check_format(path: &Path) -> Result<(), CliError> {
    if cfg!(feature = "parquet") || !is_parquet(path) {
        return Ok(());
    }
    Err(CliError::usage(
        format!("{}: this build reads and writes CSV only", path.display()),
        "build with `--features parquet`, or name a .csv file",
    ))
}

/// `value` with an SI prefix and six significant digits: `144.826 mm`, `8.48230 MN`.
pub fn engineering(value: f64, unit: &str) -> String {
    const PREFIXES: [(i32, &str); 9] =
        [(-12, "p"), (-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G"), (12, "T")];
    if value == 0.0 {
        return format!("0 {unit}");
    }
    if !value.is_finite() {
        return format!("{value} {unit}");
    }
    // Rounding to six digits first, so that 999.9999 becomes 1.00000 k.
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let exponent = rounded.abs().log10().floor() as i32;
    let thousands = exponent.div_euclid(3) * 3;
    match PREFIXES.iter().find(|(power, _)| *power == thousands) {
        Some((power, prefix)) => {
            let scaled = rounded / 10f64.powi(*power);
            let decimals = (5 - (exponent - thousands)).clamp(0, 5) as usize;
            format!("{scaled:.decimals$} {prefix}{unit}")
        }
        None => format!("{rounded:.5e} {unit}"),
    }
}

/// `value` to six significant digits without a prefix: plain between 1e-4 and 1e7, scientific beyond.
pub fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let magnitude = value.abs();
    if (1e-4..1e7).contains(&magnitude) {
        let decimals = (5 - magnitude.log10().floor() as i32).clamp(0, 9) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.5e}")
    }
}

/// A relative error for people: two digits, `0` when there is none, a dash where it is not known.
pub fn error_text(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(e) => format!("{e:.1e}"),
    }
}

/// An empty table in the house style: no frame, so that it copies well.
pub fn table(header: &[&str]) -> comfy_table::Table {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(header.iter().copied());
    table
}

/// The lines of a table, indented by two, without blanks at their ends.
pub fn table_lines(table: &comfy_table::Table) -> Vec<String> {
    // The style pads each cell by one blank.
    table.to_string().lines().map(|line| format!(" {line}").trim_end().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn engineering_prefixes_turn_at_a_thousand_after_rounding() {
        assert_eq!(engineering(0.144_826_2, "m"), "144.826 mm");
        assert_eq!(engineering(999.999_9, "s"), "1.00000 ks");
        assert_eq!(engineering(-8.482_3e6, "N"), "-8.48230 MN");
        assert_eq!(engineering(0.0, "m"), "0 m");
        assert_eq!(engineering(1e-30, "m"), "1.00000e-30 m");
    }

    #[test]
    fn significant_digits_are_six_everywhere() {
        assert_eq!(significant(6.215_430_1), "6.21543");
        assert_eq!(significant(1e-9), "1.00000e-9");
        assert_eq!(significant(123_456.7), "123457");
    }
}
