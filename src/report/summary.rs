//! `summary.md`: the verdict for a pull request, in GitHub's Markdown.

use std::fmt::Write as _;

use super::Run;
use super::families::Family;
use super::text::{number, one_line};
use crate::suite::{Counts, Verdict, summary};

/// Claims told one by one at most; the others are in `report.html`.
const TOLD_MAX: usize = 30;

/// The run in Markdown: verdict, what failed or is undecided, one line a family of claims, and the command.
pub fn to_markdown(run: &Run<'_>) -> String {
    let (verdict, counts) = summary(run.judged);
    let mut text =
        format!("## {} {}: {}\n\n{}\n\n", mark(verdict), escape(&run.suite.title), verdict.name(), told(counts));
    let told: Vec<_> =
        run.judged.iter().filter(|j| matches!(j.verdict, Verdict::Failed | Verdict::Undecided)).collect();
    if !told.is_empty() {
        text.push_str("| | claim | measured | limit | what was seen |\n|---|---|---|---|---|\n");
        for judged in told.iter().take(TOLD_MAX) {
            let claim = &judged.claim;
            let _ = writeln!(
                text,
                "| {} {} | {}<br>{} | {} | {} {} | {} |",
                mark(judged.verdict),
                judged.verdict.name(),
                code(&claim.id),
                escape(&claim.statement),
                judged.measured.map_or_else(|| "—".to_owned(), |m| number(m, 3)),
                number(claim.limit, 3),
                claim.check.unit(),
                escape(&judged.remark)
            );
        }
        if told.len() > TOLD_MAX {
            let _ = writeln!(text, "\n{} more are in `report.html`.", told.len() - TOLD_MAX);
        }
        text.push('\n');
    }
    text.push_str("<details><summary>All claims</summary>\n\n| | claims | worst | limit |\n|---|---|---|---|\n");
    for family in Family::all(run.judged) {
        let claim = &family.first().claim;
        let _ = writeln!(
            text,
            "| {} | {} ({})<br>{} | {} | {} {} |",
            mark(family.verdict()),
            code(family.id),
            family.members.len(),
            escape(&claim.statement),
            family.worst().map_or_else(|| "—".to_owned(), |m| number(m, 3)),
            number(claim.limit, 3),
            claim.check.unit()
        );
    }
    let environment = &run.environment;
    let _ = write!(
        text,
        "\n</details>\n\n{} with penetrode {} ({}), {}, {}\n",
        code(&environment.command),
        escape(environment.version),
        escape(environment.commit),
        escape(&environment.cpu),
        escape(&environment.date)
    );
    text
}

fn told(counts: Counts) -> String {
    format!(
        "**{} passed, {} failed, {} undecided**, {} skipped as not applicable",
        counts.passed, counts.failed, counts.undecided, counts.skipped
    )
}

fn mark(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "✅",
        Verdict::Failed => "❌",
        Verdict::Undecided => "❔",
        Verdict::Skipped => "➖",
    }
}

/// `text` in which nothing is Markdown, HTML, a mention or a reference.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in one_line(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            // A mention would notify its person, a reference another issue.
            '@' | '#' => {
                escaped.push(c);
                escaped.push('\u{2060}');
            }
            '\\' | '`' | '*' | '_' | '{' | '}' | '[' | ']' | '(' | ')' | '|' | '~' | '$' | '!' => {
                escaped.push('\\');
                escaped.push(c);
            }
            // Bare addresses become links; the scheme is what is looked for.
            ':' => escaped.push_str("&#58;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// `text` as code in a cell of a table.
fn code(text: &str) -> String {
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
