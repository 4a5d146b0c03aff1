//! A figure: one message, its panels, its numbers, and where they come from.
//!
//! Its words are in `pages/figures.txt`, a block of lines each, with `{0}`, `{1}` … for what the run itself gives:
//!
//! ```text
//! name section
//! + message, if every claim behind the figure passed
//! - message otherwise
//! how to read it, as many lines as needed
//! ```

use std::fmt::Display;

use maud::{PreEscaped, html};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error;

use super::chart::{Ink, Panel, WIDTH};
use super::text::{count, one_line, wrapped};
use super::typeset;
use crate::suite::{Judged, Section, Verdict, grouped};

/// Panels beside each other in a file.
const COLUMNS: usize = 3;
/// Space around panels in a file (px).
const GAP: f64 = 16.0;
/// Height of a line of the message in a file (px).
const LINE: f64 = 22.0;

/// A figure.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Figure {
    /// Name of its files, in letters, digits and hyphens.
    pub name: String,
    /// The section of a suite where it stands, if it does.
    pub section: Option<Section>,
    /// What it shows: one sentence.
    pub message: String,
    /// How to read it.
    pub reading: String,
    /// Ids of the claims that judge what is shown, or their common beginning; none for a figure that judges nothing.
    pub claims: Vec<String>,
    /// The panels.
    pub panels: Vec<Panel>,
}

/// The section that a text of ours names.
pub(super) fn section(name: &str) -> Option<Section> {
    Section::deserialize(IntoDeserializer::<Error>::into_deserializer(name)).ok()
}

impl Figure {
    /// The figure `kind` of `pages/figures.txt`, judged by the claims `judged`; `None` if its panels show nothing.
    ///
    /// `of` sets it apart from others of its kind and ends its name, `values` fill the gaps of its words.
    pub fn new(
        kind: &str,
        of: &str,
        judged: &[&Judged],
        values: &[&dyn Display],
        mut panels: Vec<Panel>,
    ) -> Option<Self> {
        panels.retain(|panel| !panel.is_empty());
        let blocks = include_str!("pages/figures.txt").split("\n\n");
        let (head, lines) = blocks
            .filter_map(|block| block.split_once('\n'))
            .find(|(head, _)| head.split_once(' ').is_some_and(|(name, _)| name == kind))?;
        let open = judged.iter().filter(|judged| judged.verdict != Verdict::Passed).count();
        let (mut messages, mut reading) = (["", ""], Vec::new());
        for line in lines.lines() {
            match line.split_at(line.len().min(2)) {
                ("+ ", message) => messages = [message; 2],
                ("- ", message) => messages[1] = message,
                _ => reading.push(line),
            }
        }
        let filled = |words: &str| {
            let values = values.iter().enumerate();
            values.fold(words.to_owned(), |words, (index, value)| {
                words.replace(&format!("{{{index}}}"), &value.to_string())
            })
        };
        let mut message = filled(messages[usize::from(open > 0)]);
        if messages[0] != messages[1] && open > 0 {
            message = format!("{message} ({open} of {})", count(judged.len(), "claim"));
        }
        let claims = grouped(judged.iter().map(|judged| judged.claim.table.as_str()), |table| *table);
        let figure = Self {
            name: name_of(kind, of),
            section: section(head.split_once(' ')?.1),
            message,
            reading: filled(&reading.join(" ")),
            claims: claims.into_iter().map(|(table, _)| table.to_owned()).collect(),
            panels,
        };
        (!figure.panels.is_empty()).then_some(figure)
    }

    /// Every number in it as CSV: one row a point.
    pub fn table(&self) -> String {
        let mut csv = "panel,series,x_axis,x,y_axis,y\n".to_owned();
        self.panels.iter().for_each(|panel| panel.push_lines(&mut csv));
        csv
    }

    /// The same with equal ranges in all panels.
    pub fn sharing_axes(mut self) -> Self {
        Panel::share_axes(&mut self.panels);
        self
    }

    /// Rows of the longest legend: all panels leave the same room, so that their diagrams stand side by side.
    fn legend_rows(&self) -> usize {
        self.panels.iter().map(Panel::legend_rows).max().unwrap_or(0)
    }

    /// A panel as an element of a page: scales with its container, named and described for screen readers. The page
    /// needs [`Ink::style_sheet`].
    pub fn inline(&self, index: usize) -> String {
        let (panel, rows) = (&self.panels[index], self.legend_rows());
        let [title, description] = ["t", "d"].map(|kind| format!("{}-{index}-{kind}", self.name));
        html! {
            svg viewBox={ "0 0 " (WIDTH) " " (panel.full_height(rows)) } role="img"
                aria-labelledby={ (title) " " (description) } {
                title id=(title) { (one_line(&self.message)) ": " (one_line(&panel.title)) }
                desc id=(description) { (one_line(&panel.description())) }
                (panel.draw(rows))
            }
        }
        .into_string()
    }

    /// The figure as an SVG file, light or dark as the viewer asks.
    pub fn file(&self) -> String {
        // Four panels are two rows of two.
        let columns = if self.panels.len() == 4 { 2 } else { self.panels.len().clamp(1, COLUMNS) };
        let rows = self.legend_rows();
        let width = GAP + columns as f64 * (WIDTH + GAP);
        let message = wrapped(&one_line(&self.message), (width - 2.0 * GAP) as usize / 9);
        let mut y = 1.5 * GAP + LINE * message.len() as f64;
        let mut places = Vec::new();
        for row in self.panels.chunks(columns) {
            places.extend(row.iter().enumerate().map(|(i, panel)| (GAP + i as f64 * (WIDTH + GAP), y, panel)));
            y += row.iter().map(|panel| panel.full_height(rows)).fold(0.0, f64::max) + GAP;
        }
        // A single panel is sized for a phone; a file is looked at on a desk.
        let scale = if columns == 1 { 2.0 } else { 1.0 };
        let descriptions: Vec<_> = self.panels.iter().map(|p| format!("{}: {}", p.title, p.description())).collect();
        html! {
            (PreEscaped("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"))
            svg xmlns="http://www.w3.org/2000/svg" width=(width * scale) height=(y * scale)
                viewBox={ "0 0 " (width) " " (y) } role="img" aria-labelledby="t d"
                font-family="system-ui, 'Segoe UI', Roboto, sans-serif" {
                title id="t" { (one_line(&self.message)) }
                desc id="d" { (one_line(&descriptions.join(" "))) }
                style { (PreEscaped(Ink::style_sheet())) }
                rect width=(width) height=(y) fill="#ffffff" class="f-paper" {}
                g font-size="15" font-weight="bold" fill="#1c222a" {
                    @for (line, text) in message.iter().enumerate() {
                        text.f-text x=(GAP) y=(GAP - 8.0 + LINE * (line as f64 + 1.0)) { (typeset::svg(text)) }
                    }
                }
                @for (x, y, panel) in places {
                    g transform={ "translate(" (x) " " (y) ")" } { (panel.draw(rows)) }
                }
            }
            (PreEscaped("\n"))
        }
        .into_string()
    }
}

/// Name of the files of the figure `kind` of `of`: letters, digits and hyphens.
pub(super) fn name_of(kind: &str, of: &str) -> String {
    let name = if of.is_empty() { kind.to_owned() } else { format!("{kind}-{}", of.trim_end_matches(".toml")) };
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).take(80).collect()
}
