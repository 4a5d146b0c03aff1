//! The report of a study of a user's code: of a table, a scheme or a solver.
//!
//! A study fills a [`StudyReport`] once. From it come the page, the summary in Markdown, `junit.xml`, the tables as CSV
//! and LaTeX, the paragraph on numerical uncertainty, and the works cited in BibTeX. All of them show what the study
//! found, and compute nothing.

mod prose;
mod sheet;

use std::fmt::Write as _;
use std::io;

use maud::{Markup, html};
use serde::Serialize;

pub use self::prose::Prose;
pub(super) use self::prose::Symbol;
pub use self::sheet::{Cell, Sheet, interval_text, order_text};
use super::figure::Figure;
use super::folder::{Files, files_of};
use super::junit::{self, Case};
use super::page::{NEXT_TABLE, Page, Part, facts, figure, folded, reproduction, sign};
use super::references::{self, Reference};
use super::text::one_line;
use super::{Environment, latex, summary};
use crate::studies::Verdict;

/// What a proved interval is, and how it is written.
pub(super) const PROVED: &str = "Proved: neither rounding nor truncation can put the exact value outside the interval. Brackets hold the digits in \
                                 which its ends differ: 0.14(57..86) is 0.1457 to 0.1486.";

/// The report of one study.
#[derive(Clone, Debug)]
pub struct StudyReport {
    /// What was judged: the name of the user's table, scheme or solver.
    pub title: String,
    /// What was judged and by what, in a sentence.
    pub subject: Prose,
    /// What it came to.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub meaning: Prose,
    /// The numbers that are read first.
    pub headline: Vec<Headline>,
    /// What follows, in order. The first section stands below the headline, under the same heading.
    pub sections: Vec<Section>,
    /// What was judged one by one.
    pub cases: Vec<Case>,
    /// Where it ran, and what remakes it.
    pub environment: Environment,
    /// What went in: names and hashes.
    pub inputs: Vec<(&'static str, String)>,
}

/// A number that is read first.
#[derive(Clone, Debug)]
pub struct Headline {
    /// What it is.
    pub label: &'static str,
    /// The number, short.
    pub value: String,
    /// Of what, and against what.
    pub note: Prose,
}

/// A part of the report with a heading.
#[derive(Clone, Debug)]
pub struct Section {
    /// Anchor.
    pub id: &'static str,
    /// Heading.
    pub title: &'static str,
    /// What stands in it.
    pub parts: Vec<Element>,
}

/// What stands in a section.
#[derive(Clone, Debug)]
pub enum Element {
    /// A paragraph.
    Text(Prose),
    /// Names and what is said of each.
    Facts(Vec<(&'static str, Prose)>),
    /// A table.
    Table(Sheet),
    /// A table that is folded until somebody opens it.
    Folded(Sheet),
    /// A figure.
    Figure(Figure),
    /// A paragraph to paste into a paper.
    Paste(Prose),
}

impl StudyReport {
    /// Every file of the report; `numbers` is what the command prints as JSON.
    ///
    /// # Errors
    /// Only what makes memory run out.
    pub fn files(&self, numbers: &impl Serialize) -> io::Result<Files> {
        let figures: Vec<Figure> = self.figures().cloned().collect();
        let mut files = files_of(numbers, self.to_html(), &figures)?;
        for sheet in self.tables() {
            files.push((format!("tables/{}.csv", sheet.name), sheet.to_csv().into_bytes()));
        }
        let xml = junit::of_cases(&self.title, &self.cases).map_err(io::Error::other)?;
        let bibtex: Vec<String> = self.cited().into_iter().map(Reference::to_bibtex).collect();
        for (name, text) in [
            ("junit.xml", xml),
            ("summary.md", self.to_markdown()),
            ("table.tex", self.latex_tables()),
            ("uncertainty.tex", self.pastes().map(|paste| paste.latex() + "\n").collect::<Vec<_>>().join("\n")),
            ("references.bib", bibtex.join("\n")),
        ] {
            files.push((name.to_owned(), text.into_bytes()));
        }
        Ok(files)
    }

    fn elements(&self) -> impl Iterator<Item = &Element> {
        self.sections.iter().flat_map(|section| &section.parts)
    }

    fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.elements().filter_map(|element| if let Element::Figure(figure) = element { Some(figure) } else { None })
    }

    fn tables(&self) -> impl Iterator<Item = &Sheet> {
        self.elements().filter_map(|element| match element {
            Element::Table(sheet) | Element::Folded(sheet) => Some(sheet),
            _ => None,
        })
    }

    fn pastes(&self) -> impl Iterator<Item = &Prose> {
        self.elements().filter_map(|element| if let Element::Paste(text) = element { Some(text) } else { None })
    }

    /// The works that its texts cite, in the order of their first citation.
    fn cited(&self) -> Vec<&'static Reference> {
        let mut cited: Vec<&'static Reference> = Vec::new();
        let mut cite = |text: &Prose| {
            for work in text.works() {
                if !cited.contains(&work) {
                    cited.push(work);
                }
            }
        };
        [&self.subject, &self.meaning].into_iter().for_each(&mut cite);
        self.headline.iter().for_each(|headline| cite(&headline.note));
        for element in self.elements() {
            match element {
                Element::Text(text) | Element::Paste(text) => cite(text),
                Element::Facts(all) => all.iter().for_each(|(_, fact)| cite(fact)),
                Element::Table(sheet) | Element::Folded(sheet) => sheet.texts().for_each(&mut cite),
                Element::Figure(_) => {}
            }
        }
        cited
    }

    fn to_html(&self) -> String {
        let cited = self.cited();
        let element = |element: &Element| match element {
            Element::Text(text) => html! { p { (text.html(&cited)) } },
            Element::Facts(all) => facts(all.iter().map(|(name, fact)| (*name, fact.html(&cited)))),
            Element::Paste(text) => html! { blockquote.paste { p { (text.html(&cited)) } } },
            Element::Table(sheet) => html! { (sheet.to_html(&cited)) (sheet.file_line()) },
            Element::Folded(sheet) => {
                let table = html! { (sheet.to_html(&cited)) (sheet.file_line()) };
                folded(html! { (NEXT_TABLE) ": " (sheet.caption.html(&cited)) }, true, table)
            }
            Element::Figure(shown) => figure(shown, ""),
        };
        let mut parts = Vec::new();
        for section in &self.sections {
            let body = html! { @for part in &section.parts { (element(part)) } };
            let body = if parts.is_empty() {
                html! { (self.result(&cited)) (body) }
            } else {
                body
            };
            parts.push(Part::new(section.id, section.title, body));
        }
        let inputs = self.inputs.iter().map(|(name, text)| (*name, html! { code { (one_line(text)) } }));
        parts.push(Part::new("reproduction", "Reproduction", reproduction(&self.environment, inputs)));
        if !cited.is_empty() {
            parts.push(Part::new("references", "References", references::list(&cited)));
        }
        Page {
            title: one_line(&self.title).into(),
            outcome: self.verdict.name(),
            subject: self.subject.html(&cited),
            purpose: "",
            environment: &self.environment,
            parts,
            files: html! {
                @for (index, (file, name)) in [("report.json", "JSON"), ("junit.xml", "JUnit XML"), ("summary.md", "Markdown"),
                    ("table.tex", "tables for LaTeX"), ("uncertainty.tex", "the paragraph on uncertainty for LaTeX"),
                    ("references.bib", "BibTeX")].into_iter().enumerate() {
                    @if index > 0 { ", " }
                    a href=(file) { (name) }
                }
            },
        }
        .to_html()
    }

    /// What is read first: the verdict in large letters, why, and the numbers.
    fn result(&self, cited: &[&Reference]) -> Markup {
        html! {
            div.verdict.(self.verdict.name()) {
                span.word { (sign(self.verdict)) " " (self.verdict.name()) }
                span.sum { (self.meaning.html(cited)) }
            }
            ul.counts.headline {
                @for Headline { label, value, note } in &self.headline {
                    li { span.quiet { (label) } b { (one_line(value)) } span.quiet { (note.html(cited)) } }
                }
            }
        }
    }

    /// The tables for a paper, in one file.
    fn latex_tables(&self) -> String {
        let mut text = latex::PREAMBLE.to_owned();
        for sheet in self.tables().filter(|sheet| !sheet.for_papers.is_empty()) {
            text.push('\n');
            text.push_str(&latex::table(sheet, &sheet.for_papers, &sheet.name));
        }
        text
    }

    /// For a pull request: verdict, numbers, the first table, what the first section says, the paragraph on uncertainty, and the command.
    fn to_markdown(&self) -> String {
        let verdict = self.verdict;
        let mut text = format!(
            "## {} {}: {}\n\n{}\n\n**{}**\n\n",
            sign(verdict),
            summary::escape(&self.title),
            verdict.name(),
            self.subject.markdown(),
            self.meaning.markdown()
        );
        for Headline { label, value, note } in &self.headline {
            let _ = writeln!(text, "- {label}: **{}** {}", summary::escape(value), note.markdown());
        }
        if let Some(sheet) = self.tables().next() {
            let _ = write!(text, "\n{}\n", sheet.to_markdown());
        }
        for part in self.sections.first().into_iter().flat_map(|section| &section.parts) {
            if let Element::Text(said) = part {
                let _ = writeln!(text, "{}\n", said.markdown());
            }
        }
        for paste in self.pastes() {
            let _ = writeln!(text, "{}\n", paste.markdown());
        }
        text + &summary::origin(&self.environment)
    }
}
