//! What the commands of the program print, and how they exit (`docs/reference.md`, "Exit codes").

use super::Subject;
use crate::suite::claim::{Found, Measurement};

check! {
    /// A run of the program: exit codes other than the stated one.
    Exits {
        /// Its arguments, quoted as for a shell; shipped scenes are `NAME.toml`.
        run: String,
        /// The exit code that is right.
        code: i32,
    } in Commands, "wrong exit codes", by exits;
}

fn exits(Exits { run, code }: &Exits, subject: &Subject<'_>) -> Found {
    let said = subject.program()?.run(run)?;
    let is_right = said.code == *code;
    let cause = if is_right { "" } else { said.err.trim() };
    let remark = format!("`penetrode {run}` exits {} {cause}", said.code);
    Ok(Measurement::count(usize::from(!is_right)).remark(remark.trim()))
}
