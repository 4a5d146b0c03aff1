//! `penetrode diagnose`: is a solver right, and if not, what is wrong with it?

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::output::{Text, escape_terminal};
use super::report_args::ReportArgs;
use super::verify::progress_bar;
use super::{Answer, Ask, CliError};
use crate::exchange::peers::Peer;
use crate::report::diagnosis::report;
use crate::studies::Verdict;
use crate::studies::diagnosis::{Asked, Cause, Diagnosis, Plan, Solver, diagnose};
use crate::text::{count, digits_text, or_dash};

/// Failing questions shown.
const SHOWN: usize = 6;

/// Arguments of `diagnose`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/diagnose.txt"))]
pub struct DiagnoseArgs {
    /// Command that starts the solver, a program that speaks the peer protocol: "python3 my_solver.py".
    #[arg(value_name = "CMD")]
    pub command: String,
    /// Seed of the questions.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Questions to ask at most.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(24..=10_000))]
    pub questions: u32,
    /// Where the report goes.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// What `diagnose --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DiagnoseJson {
    schema: &'static str,
    #[serde(flatten)]
    diagnosis: Diagnosis,
}

impl Ask for DiagnoseArgs {
    type Answer = DiagnoseJson;

    fn ask(&self) -> Result<Answer<DiagnoseJson>, CliError> {
        self.report.check("diagnose", &[])?;
        self.of(&mut Peer::start(&self.command)?)
    }
}

impl DiagnoseArgs {
    /// The diagnosis of `solver`, a program or a solver within this one; the report is written.
    ///
    /// # Errors
    /// A report that cannot be written (exit 1).
    pub fn of(&self, solver: &mut dyn Solver) -> Result<Answer<DiagnoseJson>, CliError> {
        let bar = progress_bar(u64::from(self.questions), "questions");
        let plan = Plan { seed: self.seed, questions: self.questions as usize, asks_edges: true };
        let diagnosis = diagnose(solver, plan, &|asked, all| {
            bar.set_length(all as u64);
            bar.set_position(asked as u64);
            if asked == all {
                bar.set_message("looking for the cause");
            }
        });
        bar.finish_and_clear();
        let data = DiagnoseJson { schema: "penetrode/diagnose/1", diagnosis };
        let diagnosis = &data.diagnosis;
        let written = self.report.write(&data, |environment| report(diagnosis, self.seed, environment))?;
        let (text, exit) = (text(diagnosis) + &written, diagnosis.verdict.into());
        Ok(Answer { data: Some(data), text, exit })
    }
}

fn text(found: &Diagnosis) -> String {
    let peer = &found.peer;
    let words = [peer.name.as_str(), peer.version.as_str(), peer.method.as_str()];
    let title = words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ");
    let mut text = Text::titled(Some(&title));
    let takes = if peer.fixed_step { "takes a fixed step" } else { "takes a tolerance" };
    let counts = found.counts;
    text.wrapped("  ", &format!("reads the {}, {takes}; {} asked", peer.reads, count(counts.asked, "question")));
    text.gap();
    let verdict = match found.verdict {
        Verdict::Passed => "sound: every answer is right within what it claims".to_owned(),
        Verdict::Failed if counts.failed == 0 => "wrong: see the causes".to_owned(),
        Verdict::Failed => format!("wrong: {} of {} answers fail", counts.failed, counts.asked),
        _ => format!("undecided: {} of {} answers cannot be judged", counts.undecided, counts.asked),
    };
    text.wrapped("  verdict    ", &verdict);
    if let Some(scheme) = &found.scheme {
        let words = [scheme.velocity, Some(scheme.name), scheme.events];
        let words: Vec<&str> = words.into_iter().flatten().collect();
        let off = scheme.largest_difference;
        text.wrapped("  scheme     ", &format!("{}: reproduces every answer to {off:.0e}", words.join(", ")));
    }
    for cause in &found.causes {
        cause_text(&mut text, cause);
    }
    if !found.orders.is_empty() {
        text.gap();
        let rows = found.orders.iter().map(|order| {
            [
                order.quantity.to_owned(),
                or_dash(order.formal_order, |order| digits_text(order, 2)),
                or_dash(order.observed_order, |order| format!("{order:.2}")),
                order.interval.map_or("-".to_owned(), |[low, high]| format!("{low:.2} .. {high:.2}")),
                if order.formal_order.is_none() { String::new() } else { order.verdict.name().to_owned() },
            ]
        });
        text.table(&["quantity", "order claimed", "found", "95 % interval", "verdict"], rows);
    }
    failing_text(&mut text, found);
    text.finish()
}

fn cause_text(text: &mut Text, cause: &Cause) {
    text.wrapped("  cause      ", &format!("{} ({}): {}", cause.id, cause.certainty, cause.statement));
    if cause.explains > 0
        && let Some(difference) = cause.largest_difference
    {
        let Cause { explains, of, .. } = cause;
        text.wrapped("             ", &format!("explains {explains} of {of} failing answers to {difference:.0e}"));
    }
}

/// The failing questions that meet least, with what is said and what is right.
fn failing_text(text: &mut Text, found: &Diagnosis) {
    let mut failing: Vec<&Asked> = found.questions.iter().filter(|asked| asked.verdict == Verdict::Failed).collect();
    if failing.is_empty() {
        return;
    }
    failing.sort_by_key(|asked| asked.contains.len());
    text.part("failing questions, those that meet least first".to_owned());
    for asked in failing.iter().take(SHOWN) {
        let contains: Vec<String> = asked.contains.iter().map(ToString::to_string).collect();
        let at = match (asked.rtol, asked.dt_s) {
            (Some(rtol), _) => format!(" at rtol {rtol:e}"),
            (_, Some(step)) => format!(" at dt = {step:.2e} s"),
            _ => String::new(),
        };
        text.wrapped("  ", &format!("{}{at}: {}", asked.id, contains.join(", ")));
        text.wrapped("    ", &escape_terminal(&asked.reason));
        if let Some(answered) = asked.answered {
            let row = |name: &str, end: crate::studies::diagnosis::End| {
                let number = |value: f64| format!("{value:.10e}");
                let state = end.state;
                [
                    name.to_owned(),
                    end.outcome.name().to_owned(),
                    number(state.depth),
                    number(state.time),
                    number(state.velocity),
                ]
            };
            let off = asked.relative_error.map(|error| {
                let signed = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{value:+.2e}") };
                ["off by".to_owned(), String::new(), signed(error.depth), signed(error.time), signed(error.velocity)]
            });
            let rows = [Some(row("answer", answered)), Some(row("right", asked.expected)), off];
            text.table(&["", "outcome", "depth (m)", "time (s)", "V (m/s)"], rows.into_iter().flatten());
        }
    }
    if failing.len() > SHOWN {
        text.line(format!("  {} more with --json", failing.len() - SHOWN));
    }
}
