//! What needs other programs: Python and its packages, a browser, compilers, LaTeX, a disk that is full.
//!
//! Whether they are there is known at run time only. Where one is missing, its tests say so in one line and count as
//! ignored; with `CI=true` they fail, so that a build server cannot quietly check nothing.

mod cross_check;
mod hostile_output;
mod latex;
#[path = "../it/program.rs"]
mod program;
mod report_in_browser;
mod templates;
#[path = "../it/trials.rs"]
mod trials;

use std::num::NonZero;
use std::process::ExitCode;
use std::thread::available_parallelism;

use libtest_mimic::Arguments;

fn main() -> ExitCode {
    let mut arguments = Arguments::from_args();
    // Much of the time is spent waiting for the other programs.
    arguments.test_threads.get_or_insert(2 * available_parallelism().map_or(1, NonZero::get));
    let trials = [
        cross_check::trials(&arguments),
        hostile_output::trials(),
        latex::trials(),
        report_in_browser::trials(),
        templates::trials(),
    ];
    libtest_mimic::run(&arguments, trials.into_iter().flatten().collect()).exit_code()
}
