//! A text with citations and symbols, which a page, a LaTeX file and Markdown each write in their own way.
//!
//! ```text
//! [@celik2008]     a citation, of several works with a comma between them
//! {r_21^p}         a symbol, with what is below the line behind `_` and what is raised behind `^`
//! {0}              a gap, for a text of the run: nothing in it is markup
//! `{0}`            the same as code
//! ```

use std::fmt::Display;

use maud::{Markup, Render, html};

use crate::report::references::{Reference, citation, reference};
use crate::report::{latex, summary, typeset};
use crate::text::one_line;

/// A text with citations and symbols.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prose(Vec<Piece>);

/// A symbol, with what is below and above the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct Symbol {
    pub base: &'static str,
    pub below: &'static str,
    pub above: &'static str,
}

impl Symbol {
    /// As typed: `r_21^p`.
    fn plain(self) -> String {
        let part = |sign, text: &str| if text.is_empty() { String::new() } else { format!("{sign}{text}") };
        format!("{}{}{}", self.base, part("_", self.below), part("^", self.above))
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Piece {
    Text(String),
    Said(String),
    Code(String),
    Symbol(Symbol),
    Cite(Vec<&'static Reference>),
}

impl Prose {
    /// The text of `template` with `gaps` filled.
    pub fn new(template: &'static str, gaps: &[&dyn Display]) -> Self {
        let mut pieces = Vec::new();
        let mut rest = template;
        while let Some((start, mark)) = rest.char_indices().find(|(_, c)| ['[', '{', '`'].contains(c)) {
            let end = match mark {
                '[' => "]",
                '{' => "}",
                _ => "`",
            };
            let (before, from) = rest.split_at(start);
            let Some((inside, after)) = from[1..].split_once(end) else { break };
            let gap = |text: &str| text.parse().ok().and_then(|index: usize| gaps.get(index)).map(ToString::to_string);
            let piece = match mark {
                '[' => inside.strip_prefix('@').and_then(|keys| {
                    let works: Option<Vec<_>> = keys.split(',').map(|key| reference(key.trim())).collect();
                    works.map(Piece::Cite)
                }),
                '{' => Some(gap(inside).map_or_else(
                    || {
                        let (rest, above) = inside.split_once('^').unwrap_or((inside, ""));
                        let (base, below) = rest.split_once('_').unwrap_or((rest, ""));
                        Piece::Symbol(Symbol { base, below, above })
                    },
                    Piece::Text,
                )),
                _ => {
                    let filled = inside.strip_prefix('{').and_then(|inside| gap(inside.trim_end_matches('}')));
                    Some(Piece::Code(filled.unwrap_or_else(|| inside.to_owned())))
                }
            };
            pieces.push(Piece::Text(before.to_owned()));
            // What is no citation stays as it is written.
            pieces.push(piece.unwrap_or_else(|| Piece::Text(format!("[{inside}]"))));
            rest = after;
        }
        pieces.push(Piece::Text(rest.to_owned()));
        pieces.retain(|piece| !matches!(piece, Piece::Text(text) if text.is_empty()));
        Self(pieces)
    }

    /// A text of the run: nothing in it is markup.
    #[expect(clippy::needless_pass_by_value, reason = "every caller makes it in place")]
    pub fn text(text: impl ToString) -> Self {
        Self(vec![Piece::Text(text.to_string())])
    }

    /// A sentence of the program, whose formulas are set where they can be.
    #[expect(clippy::needless_pass_by_value, reason = "every caller makes it in place")]
    pub fn said(text: impl ToString) -> Self {
        Self(vec![Piece::Said(text.to_string())])
    }

    /// A text of the run as code.
    #[expect(clippy::needless_pass_by_value, reason = "every caller makes it in place")]
    pub fn code(text: impl ToString) -> Self {
        Self(vec![Piece::Code(text.to_string())])
    }

    /// The same with `next` behind it.
    #[must_use]
    pub fn then(mut self, next: Self) -> Self {
        self.0.extend(next.0);
        self
    }

    /// The works that it cites, in order.
    pub fn works(&self) -> impl Iterator<Item = &'static Reference> {
        self.0
            .iter()
            .filter_map(|piece| if let Piece::Cite(works) = piece { Some(works) } else { None })
            .flatten()
            .copied()
    }

    /// For a page; citations are numbers by their place in `cited`.
    pub fn html(&self, cited: &[&Reference]) -> Markup {
        html! { @for piece in &self.0 {
            @match piece {
                Piece::Text(text) => (one_line(text)),
                Piece::Said(text) => (typeset::html(text)),
                Piece::Code(text) => code { (one_line(text)) },
                Piece::Symbol(Symbol { base, below, above }) => {
                    var { (base) }
                    @if !below.is_empty() { sub { (below) } }
                    @if !above.is_empty() { sup { (above) } }
                },
                Piece::Cite(works) => (citation(works, cited)),
            }
        } }
    }

    /// For LaTeX; citations need `references.bib`.
    pub fn latex(&self) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) | Piece::Said(text) => latex::escape(text),
            Piece::Code(text) => format!("\\texttt{{{}}}", latex::escape(text)),
            Piece::Symbol(symbol) => latex::symbol(*symbol),
            Piece::Cite(works) => {
                format!("\\cite{{{}}}", works.iter().map(|work| work.key).collect::<Vec<_>>().join(","))
            }
        };
        // A citation stays on the line of what it is for.
        self.0.iter().map(piece).collect::<String>().replace(" \\cite{", "~\\cite{")
    }

    /// For GitHub's Markdown, without citations.
    pub fn markdown(&self) -> String {
        self.without_citations(|piece| match piece {
            Piece::Text(text) => summary::escape(text),
            Piece::Said(text) => typeset::markdown(text),
            Piece::Code(text) => summary::code(text),
            Piece::Symbol(symbol) => summary::escape(&symbol.plain()),
            Piece::Cite(_) => String::new(),
        })
    }

    /// Without any markup: for tables of data and for test views.
    pub fn plain(&self) -> String {
        self.without_citations(|piece| match piece {
            Piece::Text(text) | Piece::Said(text) | Piece::Code(text) => text.clone(),
            Piece::Symbol(symbol) => symbol.plain(),
            Piece::Cite(_) => String::new(),
        })
    }

    /// Its pieces as `write` has them; the blank in front of a citation goes with it.
    fn without_citations(&self, write: impl Fn(&Piece) -> String) -> String {
        let mut text = String::new();
        for piece in &self.0 {
            if matches!(piece, Piece::Cite(_)) {
                text.truncate(text.trim_end().len());
            }
            text += &write(piece);
        }
        text
    }
}

impl From<&'static str> for Prose {
    fn from(template: &'static str) -> Self {
        Self::new(template, &[])
    }
}

impl Render for Prose {
    fn render(&self) -> Markup {
        self.html(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_written_for_a_page_for_latex_and_for_data() {
        let hostile = "[@celik2008] {u_num} `<b>` \\input{x} $ 50 %";
        let text = Prose::new("Bar {u_num} of `{0}` and {0} by Celik [@celik2008, roache1994]; {Δt}.", &[&hostile]);
        let cited: Vec<_> = text.works().collect();
        assert_eq!(cited.iter().map(|work| work.key).collect::<Vec<_>>(), ["celik2008", "roache1994"]);
        let escaped = "[@celik2008] {u_num} `&lt;b&gt;` \\input{x} $ 50 %";
        assert_eq!(
            text.html(&cited).into_string(),
            format!(
                "Bar <var>u</var><sub>num</sub> of <code>{escaped}</code> and {escaped} by Celik [<a \
                 href=\"#ref-celik2008\">1</a>, <a href=\"#ref-roache1994\">2</a>]; <var>Δt</var>."
            )
        );
        let latex = text.latex();
        assert!(latex.starts_with("Bar $u_{\\mathrm{num}}$ of \\texttt{[@celik2008] \\{u\\_num\\} "), "{latex}");
        assert!(latex.ends_with("by Celik~\\cite{celik2008,roache1994}; $\\Delta t$."), "{latex}");
        assert!(latex.contains("\\textbackslash{}input\\{x\\} \\$ 50 \\%"), "{latex}");
        assert_eq!(text.plain(), format!("Bar u_num of {hostile} and {hostile} by Celik; Δt."));
    }

    #[test]
    fn a_work_that_is_not_in_the_table_stays_as_it_is_written() {
        assert_eq!(Prose::from("as [@nobody] says [so").plain(), "as [@nobody] says [so");
    }
}
