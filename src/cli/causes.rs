//! `penetrode causes`: what a diagnosis may find wrong with a solver, and what each fault makes of an answer.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::output::Text;
use super::{Answer, Ask, CliError, Exit};
use crate::studies::diagnosis::{Each, Effect, KnownCause, known_causes};

/// Questions among which one that shows a cause is looked for, their seed, and how many are shown of each.
const QUESTIONS: usize = 60;
const SEED: u64 = 1;
const EFFECTS: usize = 3;

/// Arguments of `causes`.
#[derive(Args, Debug)]
#[command(after_help = "Examples: penetrode causes\n          penetrode causes drag\n          \
    penetrode causes rest-threshold --json")]
pub struct CausesArgs {
    /// Only causes whose id or sentence contains this.
    pub text: Option<String>,
}

/// What `causes --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CausesJson {
    schema: &'static str,
    causes: Vec<KnownCause>,
}

impl Ask for CausesArgs {
    type Answer = CausesJson;

    fn ask(&self) -> Result<Answer<CausesJson>, CliError> {
        let mut causes = known_causes(SEED, QUESTIONS, EFFECTS);
        if let Some(wanted) = &self.text {
            causes.retain(|cause| cause.id.contains(wanted) || cause.statement.contains(wanted));
            if causes.is_empty() {
                let help = "`penetrode causes` lists all; those that are measured stand in docs/reference.md";
                return Err(CliError::usage(format!("no cause has `{wanted}` in its id or sentence"), help));
            }
        }
        let text = text(&causes);
        Ok(Answer { data: Some(CausesJson { schema: "penetrode/causes/1", causes }), text, exit: Exit::Success })
    }
}

/// The causes by id, each with the first question that shows it.
fn text(causes: &[KnownCause]) -> String {
    let mut text = Text::default();
    let mut before = "";
    for KnownCause { id, statement, effects, .. } in causes {
        if *id != before {
            text.line((*id).to_owned());
            before = id;
        }
        text.wrapped("  ", statement);
        if let Some(Effect { question, relative_error: Each { depth, time, velocity }, .. }) = effects.first() {
            let off = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{value:+.2e}") };
            let (depth, time, velocity) = (off(*depth), off(*time), off(*velocity));
            text.wrapped("    ", &format!("{question}: depth {depth}, time {time}, V {velocity}"));
        }
    }
    text.finish()
}
