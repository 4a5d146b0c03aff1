//! A figure: one message, its panels, its numbers, and where they come from.

use std::fmt::Write as _;

use super::chart::{DrawError, Ink, Panel, WIDTH};
use super::table::Table;
use super::text::{one_line, wrapped};

/// Panels beside each other in a file.
const COLUMNS: usize = 3;
/// Space around panels in a file [px].
const GAP: i32 = 16;
/// Height of a line of the message in a file [px].
const LINE: i32 = 22;

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
    /// What accuracy costs.
    Cost,
    /// The paper's curve over the thickness.
    Slab,
    /// Where Eq. 11-12 holds.
    Applicability,
    /// Measured depths.
    Measured,
    /// Targets of layers.
    Layers,
    /// Stability and rounding.
    Stability,
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
        let width = (0..columns).fold(GAP, |width, _| width + WIDTH + GAP);
        let message = wrapped(&self.figure.message, (width - 2 * GAP) as usize / 9);
        // A single panel is sized for a phone; a file is looked at on a desk.
        let larger = if columns == 1 { 2 } else { 1 };
        let head = message.iter().fold(GAP + GAP / 2, |head, _| head + LINE);
        let mut body = String::new();
        let mut y = head;
        for row in (0..self.panels.len()).collect::<Vec<_>>().chunks(columns) {
            let (mut x, mut height) = (GAP, 0);
            for &index in row {
                let panel = &self.figure.panels[index];
                let _ = writeln!(
                    body,
                    "<svg x=\"{x}\" y=\"{y}\" width=\"{WIDTH}\" height=\"{}\" viewBox=\"{}\">\n{}</svg>",
                    panel.height,
                    panel.view_box(),
                    self.panels[index]
                );
                x += WIDTH + GAP;
                height = height.max(panel.height);
            }
            y += height + GAP;
        }
        let mut title = String::new();
        let mut line = GAP - 8;
        for text in &message {
            line += LINE;
            let _ = writeln!(
                title,
                "<text x=\"{GAP}\" y=\"{line}\" font-size=\"15\" font-weight=\"bold\" fill=\"#1C222A\" \
                 class=\"f-text\">{}</text>",
                escape(text)
            );
        }
        let descriptions: Vec<_> =
            self.figure.panels.iter().map(|p| format!("{}: {}", p.title, p.description)).collect();
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {y}\" \
             role=\"img\" aria-labelledby=\"t d\" font-family=\"system-ui, 'Segoe UI', Roboto, sans-serif\">\n\
             <title id=\"t\">{}</title>\n<desc id=\"d\">{}</desc>\n\
             <style>{}:root{{--paper:#fff}}.paper{{fill:var(--paper)}}\
             svg svg text{{paint-order:stroke;stroke:var(--paper);stroke-width:12px;stroke-linejoin:round}}\
             @media screen and (prefers-color-scheme:dark){{:root{{--paper:#161a20}}}}</style>\n\
             <rect width=\"{width}\" height=\"{y}\" fill=\"#fff\" class=\"paper\"/>\n{title}{body}</svg>\n",
            width * larger,
            y * larger,
            escape(&self.figure.message),
            escape(&descriptions.join(" ")),
            Ink::style_sheet(),
        )
    }
}

/// `text` on one line for XML and HTML, in elements and attributes.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in one_line(text).chars() {
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
