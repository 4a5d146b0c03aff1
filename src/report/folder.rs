//! The report folder, moved into place whole: an interrupted run leaves the old report or none.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use super::figure::Figure;
use super::text::shortened;
use super::{Run, VerifyJson, figures, junit, summary, verify_page};
use crate::exchange::interruption;

/// Why there is no report.
#[derive(Debug, Error)]
pub enum FolderError {
    /// A folder that is not a report of ours, or holds more than one: exit 2, and nothing is touched.
    #[error("{path} {why}")]
    NotOurs {
        /// The folder.
        path: String,
        /// Why it is not replaced.
        why: String,
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

impl FolderError {
    fn write(path: &Path, cause: io::Error) -> Self {
        Self::Write { path: path.display().to_string(), cause: without_temporary_name(cause) }
    }
}

/// Name of the folder where none is given.
pub const DEFAULT: &str = "penetrode-report";

/// The same of a run of a part of the claims.
pub const DEFAULT_OF_PART: &str = "penetrode-report-part";

/// Refuses a folder that exists and is no report of `command`, or cannot be written, before any work is done.
///
/// # Errors
/// [`FolderError`].
pub fn check(folder: &Path, command: &str) -> Result<(), FolderError> {
    let refuse = |why: String| Err(FolderError::NotOurs { path: folder.display().to_string(), why });
    let failed = |cause| FolderError::write(folder, cause);
    // Reading would follow a link, and writing would replace it: it is refused like any other foreign entry.
    match fs::symlink_metadata(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return try_to_write(folder),
        Err(cause) => return Err(failed(cause)),
        Ok(metadata) if metadata.is_symlink() => return refuse("is a link, which a report would replace".to_owned()),
        Ok(metadata) if !metadata.is_dir() => return refuse("is a file, and a report is a folder".to_owned()),
        Ok(_) => {}
    }
    let contents = contents(folder).map_err(failed)?;
    if contents.is_empty() {
        return try_to_write(folder);
    }
    let Some((author, written)) = manifest(folder) else {
        return refuse("exists and is not a report of penetrode".to_owned());
    };
    if author != command {
        return refuse(format!("holds a report of `{author}`, which one of `{command}` does not replace"));
    }
    match contents.iter().find(|name| !written.contains(name)) {
        Some(foreign) => refuse(format!("holds `{foreign}`, which is no part of the report there and would be lost")),
        None => try_to_write(folder),
    }
}

/// Makes and removes a folder where the report at `folder` will be made: the system says by that alone whether it can be.
fn try_to_write(folder: &Path) -> Result<(), FolderError> {
    let is_there = |place: &&Path| !place.as_os_str().is_empty() && place.exists();
    let place = folder.ancestors().skip(1).find(is_there).unwrap_or(Path::new("."));
    interruption::folder_in(place).map(drop).map_err(|cause| FolderError::write(folder, cause))
}

/// Every file under `folder` by its path in it, parts joined by `/`; a folder without files by its own name.
fn contents(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        // A report has folders of one level. What lies deeper is listed under them, and is not ours.
        if entry.file_type()?.is_dir() {
            let inside = fs::read_dir(entry.path())?
                .map(|inner| inner.map(|inner| format!("{name}/{}", inner.file_name().to_string_lossy())))
                .collect::<io::Result<Vec<_>>>()?;
            names.extend(if inside.is_empty() && !FOLDERS.contains(&name.as_str()) { vec![name] } else { inside });
        } else {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// The folders in a report.
const FOLDERS: [&str; 2] = ["figures", "tables"];

/// Refuses a folder that holds a report on all claims of a suite, which one on a part of them must not replace.
///
/// # Errors
/// [`FolderError`].
pub fn check_for_part(folder: &Path) -> Result<(), FolderError> {
    let is_whole = |report: &serde_json::Value| report["schema"] == "penetrode/verify/1" && report["only"].is_null();
    if report_in(folder).is_some_and(|report| is_whole(&report)) {
        let why = "holds a report on all claims, which one on a part of them would replace".to_owned();
        return Err(FolderError::NotOurs { path: folder.display().to_string(), why });
    }
    Ok(())
}

/// The numbers of the report in `folder`.
fn report_in(folder: &Path) -> Option<serde_json::Value> {
    serde_json::from_slice(&fs::read(folder.join("report.json")).ok()?).ok()
}

/// The command that wrote the report in `folder`, and what it consists of by the list in it; `None` where there is none.
fn manifest(folder: &Path) -> Option<(String, Vec<String>)> {
    let report = report_in(folder)?;
    let command = command_of(&report)?;
    let list = fs::read_to_string(folder.join(MANIFEST)).unwrap_or_default();
    Some((command, list.lines().map(str::to_owned).chain(["report.json".to_owned()]).collect()))
}

/// The command whose answer `report` is, by its schema: `audit` of `penetrode/audit/1`.
fn command_of(report: &serde_json::Value) -> Option<String> {
    let command = report.get("schema")?.as_str()?.strip_prefix("penetrode/")?.split('/').next()?;
    Some(shortened(command))
}

/// The file that lists the files of a report, one a line: what is not in it is somebody else's.
const MANIFEST: &str = "contents.txt";

/// Writes `files`, a path in the folder and bytes each, to `folder`, and their list. `report.json` must be among them.
///
/// # Errors
/// [`FolderError`]; the old report then stands untouched.
pub fn write(files: io::Result<Files>, folder: &Path) -> Result<(), FolderError> {
    let mut files = files.map_err(|cause| FolderError::write(folder, cause))?;
    let report = files.iter().find(|(name, _)| name == "report.json");
    let command = report.and_then(|(_, bytes)| command_of(&serde_json::from_slice(bytes).ok()?));
    check(folder, &command.unwrap_or_default())?;
    let list: String =
        files.iter().map(|(name, _)| name.as_str()).chain([MANIFEST]).flat_map(|name| [name, "\n"]).collect();
    files.push((MANIFEST.to_owned(), list.into_bytes()));
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(parent).map_err(|cause| FolderError::write(parent, cause))?;
    interruption::whole(|| {
        let stage = interruption::folder_in(parent).map_err(|cause| FolderError::write(parent, cause))?;
        fill(stage.path(), files, folder)?;
        stage.finish(|stage| move_into_place(stage, folder)).map_err(|cause| FolderError::write(folder, cause))
    })
}

/// Writes `files` to `stage`, which will become `folder`.
fn fill(stage: &Path, files: Files, folder: &Path) -> Result<(), FolderError> {
    let failed = FolderError::write;
    for (name, bytes) in files {
        let written = interruption::write_below(stage, Path::new(&name), &bytes);
        written.map_err(|cause| failed(&folder.join(&name), cause))?;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // A temporary folder is private; a report is to be shown.
        fs::set_permissions(stage, fs::Permissions::from_mode(0o755)).map_err(|cause| failed(folder, cause))?;
    }
    Ok(())
}

/// What the system said, without the name of a temporary file that `error` may name: nobody asked for that file.
pub fn without_temporary_name(error: io::Error) -> io::Error {
    if error.to_string().contains(interruption::PREFIX) { error.kind().into() } else { error }
}

/// The files of a report: path in its folder, and bytes.
pub type Files = Vec<(String, Vec<u8>)>;

/// Every file of the report of `verify`.
///
/// # Errors
/// Only what makes memory run out.
pub fn files(run: &Run<'_>) -> io::Result<Files> {
    let figures = figures::all(run);
    let mut files = files_of(&VerifyJson::new(run), verify_page::to_html(run, &figures), &figures)?;
    files.push(("junit.xml".to_owned(), junit::to_xml(run).map_err(io::Error::other)?.into_bytes()));
    files.push(("summary.md".to_owned(), summary::to_markdown(run).into_bytes()));
    Ok(files)
}

/// The files that every report has: its numbers, its page, and the drawing and the numbers of each figure.
///
/// # Errors
/// Only what makes memory run out.
pub(super) fn files_of(numbers: &impl Serialize, page: String, figures: &[Figure]) -> io::Result<Files> {
    let mut json = serde_json::to_vec_pretty(numbers)?;
    json.push(b'\n');
    let mut files = vec![("report.json".to_owned(), json), ("report.html".to_owned(), page.into_bytes())];
    for figure in figures {
        let name = &figure.name;
        files.push((format!("figures/{name}.svg"), figure.file().into_bytes()));
        files.push((format!("tables/{name}.csv"), figure.table().into_bytes()));
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
