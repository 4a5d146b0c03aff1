//! `summary.md`: the verdict for a pull request, in GitHub's Markdown.

use std::fmt::Write as _;

use super::page::{sign, tally};
use super::text::{count, number, one_line};
use super::typeset;
use super::{Environment, Run};
use crate::suite::{Counts, of_cases, tables, worst};

/// Claims listed one by one at most; the others are in `report.html`.
const LISTED_MAX: usize = 30;

/// The run in Markdown: verdict, what failed or is undecided, one line a table of claims, and the command.
pub fn to_markdown(run: &Run<'_>) -> String {
    let counts = Counts::of_claims(run.judged);
    let verdict = counts.verdict();
    let mut text =
        format!("## {} {}: {}\n\n**{}**\n\n", sign(verdict), escape(&run.suite.title), verdict.name(), tally(counts));
    let open: Vec<_> = run.judged.iter().filter(|j| j.is_open()).collect();
    if !open.is_empty() {
        text.push_str("| | claim | measured | limit | what was seen |\n|---|---|---|---|---|\n");
        for judged in open.iter().take(LISTED_MAX) {
            let claim = &judged.claim;
            let _ = writeln!(
                text,
                "| {} {} | {}<br>{} | {}{} | {} {} | {} |",
                sign(judged.verdict),
                judged.verdict.name(),
                code(&claim.id),
                typeset::markdown(&claim.statement),
                judged.measured.map_or_else(|| "—".to_owned(), |m| number(m, 3)),
                of_cases([*judged]).map_or_else(String::new, |cases| format!(" in {}", count(cases, "case"))),
                number(claim.limit, 3),
                claim.unit_in_words(),
                escape(&judged.remark)
            );
        }
        if open.len() > LISTED_MAX {
            let _ = writeln!(text, "\n{} more are in `report.html`.", open.len() - LISTED_MAX);
        }
        text.push('\n');
    }
    text.push_str("<details><summary>All claims</summary>\n\n| | claims | worst | limit |\n|---|---|---|---|\n");
    for claims in tables(run.judged) {
        let claim = &claims[0].claim;
        let _ = writeln!(
            text,
            "| {} | {} ({})<br>{} | {}{} | {} {} |",
            sign(Counts::of_claims(claims).of_group()),
            code(&claim.table),
            claims.len(),
            typeset::markdown(&claim.statement),
            worst(claims).map_or_else(|| "—".to_owned(), |m| number(m, 3)),
            of_cases(claims).map_or_else(String::new, |cases| format!(" in {}", count(cases, "case"))),
            number(claim.limit, 3),
            claim.unit_in_words()
        );
    }
    text.push_str("\n</details>\n\n");
    text + &origin(&run.environment)
}

/// The command, the program, the machine and the date, in a line.
pub(super) fn origin(environment: &Environment) -> String {
    format!(
        "{} with penetrode {} ({}), {}, {}\n",
        code(&environment.command),
        escape(environment.version),
        escape(environment.commit),
        escape(&environment.cpu),
        escape(&environment.date)
    )
}

/// `text` in which nothing is Markdown, HTML, a mention or a reference.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in one_line(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            // A mention would notify its person, a reference another issue.
            '@' | '#' => escaped.extend([c, '\u{2060}']),
            '\\' | '`' | '*' | '_' | '{' | '}' | '[' | ']' | '(' | ')' | '|' | '~' | '$' | '!' => {
                escaped.extend(['\\', c]);
            }
            // Bare addresses become links; the scheme is what is looked for.
            ':' => escaped.push_str("&#58;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// `text` as code in a cell of a table.
pub(super) fn code(text: &str) -> String {
    format!("<code>{}</code>", escape(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_others_is_no_markdown() {
        let hostile = "a | b\n# c [x](http://y) <img src=z> *d* @e `f`";
        let escaped = escape(hostile);
        assert!(!escaped.contains('\n') && !escaped.contains("<img") && !escaped.contains("://"), "{escaped}");
        for c in ['|', '[', ']', '*', '`'] {
            assert_eq!(escaped.matches(c).count(), escaped.matches(&format!("\\{c}")).count(), "{c} in {escaped}");
        }
    }
}
