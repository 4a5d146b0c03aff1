//! What the commands of the program print, and how they exit (`docs/reference.md`, "Exit codes").

mod answer;
mod printed;
mod report;
mod ties;

pub use self::{printed::*, report::*, ties::*};
use super::{Subject, complete_build};
use crate::suite::claim::{Found, Measurement, NotMeasured};
use crate::suite::transcript::{TRANSCRIPTS, Transcript, misjudged};

check! {
    /// A run of the program: exit codes other than the stated one.
    Exits {
        /// Its arguments, quoted as for a shell; shipped scenes are `NAME.toml`.
        run: String,
        /// The exit code that is right.
        code: i32,
    } in Commands, "wrong exit codes", by exits, compares (Commands | Elsewhere);

    /// Runs of the program beside what they said when a person last read it.
    Recorded {
        /// File of `verification/transcript`, without its ending.
        runs: String,
        /// Relative tolerance of the numbers.
        #[serde(deserialize_with = "crate::suite::checks::share")]
        tolerance: f64,
    } in Commands, "lines that differ", by recorded, compares nothing;

    /// A recorded run beside itself with a change: changes that are not seen, and round-off that is called a difference.
    ChangedRecord {} in Commands, "changes", by changed_record, compares nothing;
}

fn exits(Exits { run, code }: &Exits, subject: &Subject<'_>) -> Found {
    let said = subject.program()?.run(run)?;
    let is_right = said.code == *code;
    let cause = if is_right { "" } else { said.err.trim() };
    let remark = format!("`penetrode {run}` exits {} {cause}", said.code);
    Ok(Measurement::count(usize::from(!is_right)).remark(remark.trim()))
}

fn changed_record(_: &Subject<'_>) -> Found {
    let (tried, wrong) = misjudged()?;
    let remark = wrong.first().map_or_else(|| format!("{tried} changes"), |change| format!("misjudged: {change}"));
    Ok(Measurement::count(wrong.len()).remark(remark).cases(tried))
}

fn recorded(Recorded { runs, tolerance }: &Recorded, subject: &Subject<'_>) -> Found {
    let program = subject.program()?;
    let text = TRANSCRIPTS.iter().find(|(name, _)| name == runs).map(|(_, text)| *text);
    let recorded = Transcript::read(text.ok_or_else(|| NotMeasured::broken(format!("no transcript {runs}")))?)?;
    complete_build()?;
    if !cfg!(unix) {
        return Err(NotMeasured::lacks("solvers of the recorded runs are shell scripts"));
    }
    let found = recorded.differences(&recorded.again(program)?, *tolerance);
    let remark = if found.lines == 0 { format!("{} runs", recorded.len()) } else { found.first };
    Ok(Measurement::count(found.lines).remark(remark).cases(recorded.len()))
}
