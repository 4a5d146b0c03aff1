//! A figure: one message, its panels, its numbers, and where they come from.

use std::fmt::Write as _;

use super::chart::{DrawError, Ink, Panel, WIDTH};
use super::table::Table;

/// Panels beside each other in a file.
const COLUMNS: usize = 3;
/// Space around panels in a file [px].
const GAP: u32 = 16;
/// Height of a line of the message in a file [px].
const LINE: u32 = 22;

/// The part of the report that shows a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// What is solved.
    Model,
    /// Orders and constants beside the exact answer.
    CodeVerification,
    /// Other programs.
    CrossCode,
    /// Events.
    Events,
    /// Energy.
    Energy,
}

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name of its files, in letters, digits and hyphens.
    pub name: String,
    /// Where it stands.
    pub part: Part,
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

/// The panels of a figure, drawn.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The figure.
    pub figure: Figure,
    /// Elements of each panel.
    pub panels: Vec<String>,
}

impl Figure {
    /// Draws the panels.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn draw(self) -> Result<Drawn, DrawError> {
        let panels = self.panels.iter().map(Panel::draw).collect::<Result<_, _>>()?;
        Ok(Drawn { figure: self, panels })
    }
}

impl Drawn {
    /// A panel as an element of a page: scales with its container, named and described for screen readers.
    pub fn inline(&self, index: usize) -> String {
        let panel = &self.figure.panels[index];
        let id = format!("{}-{index}", self.figure.name);
        format!(
            "<svg viewBox=\"{}\" role=\"img\" aria-labelledby=\"{id}-t {id}-d\"><title id=\"{id}-t\">{}</title>\
             <desc id=\"{id}-d\">{}</desc>\n{}</svg>",
            panel.view_box(),
            escape(&format!("{}: {}", self.figure.message, panel.title)),
            escape(&panel.description),
            self.panels[index],
        )
    }

    /// The figure as a file of its own, light or dark as the viewer asks.
    pub fn file(&self) -> String {
        let columns = self.figure.panels.len().clamp(1, COLUMNS);
        let width = columns as u32 * (WIDTH + GAP) + GAP;
        let message = wrapped(&self.figure.message, (width - 2 * GAP) as usize / 8);
        let head = GAP + LINE * message.len() as u32 + GAP / 2;
        let mut body = String::new();
        let mut y = head;
        for row in (0..self.panels.len()).collect::<Vec<_>>().chunks(columns) {
            let mut height = 0;
            for (column, &index) in row.iter().enumerate() {
                let panel = &self.figure.panels[index];
                let _ = write!(
                    body,
                    "<svg x=\"{}\" y=\"{y}\" width=\"{WIDTH}\" height=\"{}\" viewBox=\"{}\">\n{}</svg>\n",
                    GAP + column as u32 * (WIDTH + GAP),
                    panel.height,
                    panel.view_box(),
                    self.panels[index]
                );
                height = height.max(panel.height);
            }
            y += height + GAP;
        }
        let mut title = String::new();
        for (line, text) in message.iter().enumerate() {
            let _ = write!(
                title,
                "<text x=\"{GAP}\" y=\"{}\" font-size=\"15\" font-weight=\"bold\" fill=\"#1C222A\" \
                 class=\"f-text\">{}</text>\n",
                GAP + LINE * (line as u32 + 1) - 8,
                escape(text)
            );
        }
        let descriptions: Vec<_> =
            self.figure.panels.iter().map(|p| format!("{}: {}", p.title, p.description)).collect();
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{y}\" viewBox=\"0 0 {width} {y}\" \
             role=\"img\" aria-labelledby=\"t d\" font-family=\"system-ui, 'Segoe UI', Roboto, sans-serif\">\n\
             <title id=\"t\">{}</title>\n<desc id=\"d\">{}</desc>\n\
             <style>{}.paper{{fill:#fff}}@media screen and (prefers-color-scheme:dark){{.paper{{fill:#161a20}}}}</style>\n\
             <rect width=\"{width}\" height=\"{y}\" fill=\"#fff\" class=\"paper\"/>\n{title}{body}</svg>\n",
            escape(&self.figure.message),
            escape(&descriptions.join(" ")),
            Ink::style_sheet(),
        )
    }
}

/// `text` for XML and HTML, in elements and attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// `text` in lines of `most` characters, broken at spaces.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].chars().count() + 1 + word.chars().count() > most {
            lines.push(word.to_owned());
        } else {
            let line = &mut lines[last];
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}
