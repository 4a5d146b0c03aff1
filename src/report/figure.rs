//! A figure: one message, its panels, its numbers, and where they come from.

use maud::{PreEscaped, html};

use super::chart::{Ink, Panel, WIDTH};
use super::table::Table;
use super::text::{one_line, wrapped};
use crate::suite::Section;

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
    /// Where it stands.
    pub section: Section,
    /// What it shows: one sentence.
    pub message: String,
    /// How to read it.
    pub reading: String,
    /// Ids of the claims that judge what is shown, or their common beginning; none for a figure that judges nothing.
    pub claims: Vec<String>,
    /// The panels.
    pub panels: Vec<Panel>,
    /// Every number in it.
    pub table: Table,
}

impl Figure {
    /// A figure that no claim judges; `None` if its panels show nothing.
    pub fn new(
        name: impl Into<String>,
        section: Section,
        message: impl Into<String>,
        reading: impl Into<String>,
        panels: Vec<Panel>,
        table: Table,
    ) -> Option<Self> {
        let (name, message, reading) = (name.into(), message.into(), reading.into());
        let is_empty = panels.iter().all(Panel::is_empty);
        (!is_empty).then_some(Self { name, section, message, reading, claims: Vec::new(), panels, table })
    }

    /// The same with the claims that judge it.
    pub fn judged_by(self, claims: Vec<String>) -> Self {
        Self { claims, ..self }
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
        let (rows, columns) = (self.legend_rows(), self.panels.len().clamp(1, COLUMNS));
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
                        text.f-text x=(GAP) y=(GAP - 8.0 + LINE * (line as f64 + 1.0)) { (text) }
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

/// `items` by `key`, groups in the order in which they first appear.
pub(super) fn grouped<T: Copy, K: PartialEq>(
    items: impl IntoIterator<Item = T>,
    key: impl Fn(&T) -> K,
) -> Vec<(K, Vec<T>)> {
    let mut groups: Vec<(K, Vec<T>)> = Vec::new();
    for item in items {
        let key = key(&item);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, members)) => members.push(item),
            None => groups.push((key, vec![item])),
        }
    }
    groups
}
