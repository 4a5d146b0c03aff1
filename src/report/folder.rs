//! The report folder, moved into place whole: an interrupted run leaves the old report or none.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::figure::{Drawn, Figure};
use super::{Run, VerifyJson, figures, junit, page, summary};

/// Why there is no report.
#[derive(Debug, Error)]
pub enum FolderError {
    /// A folder that is not a report of ours: exit 2, and nothing is touched.
    #[error("{path} exists and is not a report of penetrode")]
    NotOurs {
        /// The folder.
        path: String,
    },
    /// The system refused.
    #[error("cannot write {path}: {cause}")]
    Write {
        /// What was being written.
        path: String,
        /// What the system said.
        cause: io::Error,
    },
}

/// Name of the folder where none is given.
pub const DEFAULT: &str = "penetrode-report";

/// Refuses a folder that exists and is not a report of ours, before any work is done.
///
/// # Errors
/// [`FolderError::NotOurs`].
pub fn check(folder: &Path) -> Result<(), FolderError> {
    let ours = || {
        let text = fs::read(folder.join("report.json")).ok()?;
        let value: serde_json::Value = serde_json::from_slice(&text).ok()?;
        value.get("schema")?.as_str().map(|schema| schema.starts_with("penetrode/"))
    };
    // A link is followed for reading and would be replaced in writing: refused like any other strange thing.
    match fs::symlink_metadata(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Ok(metadata) if metadata.is_dir() && ours() == Some(true) => Ok(()),
        _ => Err(FolderError::NotOurs { path: folder.display().to_string() }),
    }
}

/// Writes the report of `run` to `folder`.
///
/// # Errors
/// [`FolderError`]; the old report then stands untouched.
pub fn write(run: &Run<'_>, folder: &Path) -> Result<(), FolderError> {
    check(folder)?;
    let failed = |cause| FolderError::Write { path: folder.display().to_string(), cause };
    write_files(files(run).map_err(failed)?, folder)
}

/// Writes `files`, a path in the folder and bytes each, to `folder`. `report.json` must be among them.
///
/// # Errors
/// [`FolderError`]; the old report then stands untouched.
pub fn write_files(files: Vec<(String, Vec<u8>)>, folder: &Path) -> Result<(), FolderError> {
    check(folder)?;
    let failed = |path: &Path, cause: io::Error| FolderError::Write { path: path.display().to_string(), cause };
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    fs::create_dir_all(&parent).map_err(|cause| failed(&parent, cause))?;
    let stage = tempfile::Builder::new()
        .prefix(".penetrode-report-")
        .tempdir_in(&parent)
        .map_err(|cause| failed(&parent, cause))?;
    for (name, bytes) in files {
        let path = stage.path().join(&name);
        if let Some(part) = path.parent() {
            fs::create_dir_all(part).map_err(|cause| failed(part, cause))?;
        }
        fs::write(&path, bytes).map_err(|cause| failed(&folder.join(&name), cause))?;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // A temporary folder is private; a report is to be shown.
        fs::set_permissions(stage.path(), fs::Permissions::from_mode(0o755)).map_err(|cause| failed(folder, cause))?;
    }
    move_into_place(stage, folder).map_err(|cause| failed(folder, cause))
}

/// Every file of the report: its path in the folder, and its bytes.
///
/// # Errors
/// Only what makes memory run out, or a figure that cannot be drawn.
pub fn files(run: &Run<'_>) -> io::Result<Vec<(String, Vec<u8>)>> {
    let figures =
        figures::all(run).into_iter().map(Figure::draw).collect::<Result<Vec<_>, _>>().map_err(io::Error::other)?;
    let mut json = serde_json::to_vec_pretty(&VerifyJson::new(run))?;
    json.push(b'\n');
    let mut files = vec![
        ("report.json".to_owned(), json),
        ("report.html".to_owned(), page::to_html(run, &figures).into_bytes()),
        ("junit.xml".to_owned(), junit::to_xml(run).map_err(io::Error::other)?.into_bytes()),
        ("summary.md".to_owned(), summary::to_markdown(run).into_bytes()),
    ];
    files.extend(figure_files(&figures)?);
    Ok(files)
}

/// The drawing and the numbers of each figure.
///
/// # Errors
/// Only what makes memory run out.
pub fn figure_files(figures: &[Drawn]) -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for drawn in figures {
        let name = &drawn.figure.name;
        files.push((format!("figures/{name}.svg"), drawn.file().into_bytes()));
        files.push((format!("tables/{name}.csv"), drawn.figure.table.to_csv().map_err(io::Error::other)?));
    }
    Ok(files)
}

/// Moves the finished folder over the old one: the old is set aside first and removed last, and put back on failure.
fn move_into_place(stage: tempfile::TempDir, folder: &Path) -> io::Result<()> {
    if !folder.exists() {
        fs::rename(stage.path(), folder)?;
        // The folder lives on under its new name.
        let _ = stage.keep();
        return Ok(());
    }
    let mut aside = stage.path().as_os_str().to_owned();
    aside.push(".old");
    let aside = PathBuf::from(aside);
    fs::rename(folder, &aside)?;
    if let Err(error) = fs::rename(stage.path(), folder) {
        fs::rename(&aside, folder)?;
        return Err(error);
    }
    let _ = stage.keep();
    fs::remove_dir_all(&aside)
}
