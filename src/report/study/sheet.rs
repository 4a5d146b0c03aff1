//! A table of a study's report: for a page, for a paper, as data, and in Markdown.

use maud::{Markup, html};

use super::Prose;
use crate::exchange::tables::{Value, push_line};
use crate::report::page::{Table, badge, sign};
use crate::report::references::Reference;
use crate::report::summary;
use crate::report::text::{count, number};
use crate::studies::Verdict;

/// A table.
#[derive(Clone, Debug)]
#[must_use]
pub struct Sheet {
    /// Name of its file, in letters, digits and hyphens.
    pub name: String,
    /// What it shows, without a full stop.
    pub caption: Prose,
    /// Heads of its columns.
    pub header: Vec<Prose>,
    /// Its rows; the first cell of each is its head.
    pub rows: Vec<Vec<Cell>>,
    /// The columns that belong into a paper, the first not counted; none where it does not.
    pub for_papers: Vec<usize>,
    /// Whether it is a grid of numbers, which scrolls on a narrow screen; rows turn into cards there otherwise.
    is_grid: bool,
}

/// What stands in a cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Nothing.
    Empty,
    /// A text.
    Prose(Prose),
    /// A number with so many digits on a page, and all of them as data; a dash where there is none.
    Number(Option<f64>, usize),
    /// An order, with two decimals.
    Order(Option<f64>),
    /// An interval of orders.
    Interval(Option<[f64; 2]>),
    /// A verdict.
    Verdict(Verdict),
    /// How many of how many; a dash for none of none.
    Of(usize, usize),
}

impl Cell {
    /// Text of the run.
    pub fn text(text: impl ToString) -> Self {
        Self::Prose(Prose::text(text))
    }

    /// Text of the run as code.
    pub fn code(text: impl ToString) -> Self {
        Self::Prose(Prose::code(text))
    }

    /// As print has it.
    pub(in crate::report) fn plain(&self) -> String {
        let dash = || "—".to_owned();
        match self {
            Self::Empty => String::new(),
            Self::Prose(text) => text.plain(),
            Self::Number(value, digits) => value.map_or_else(dash, |value| number(value, *digits)),
            Self::Order(value) => value.map_or_else(dash, order_text),
            Self::Interval(interval) => interval.map_or_else(dash, interval_text),
            Self::Verdict(verdict) => verdict.name().to_owned(),
            Self::Of(_, 0) => dash(),
            Self::Of(some, all) => format!("{some} of {all}"),
        }
    }

    fn html(&self, cited: &[&Reference]) -> Markup {
        match self {
            Self::Prose(text) => text.html(cited),
            Self::Verdict(verdict) => badge(*verdict),
            // A part that did not pass stands out.
            Self::Of(some, all) if some < all => html! { span.failed { (self.plain()) } },
            _ => html! { (self.plain()) },
        }
    }

    /// For LaTeX.
    pub(in crate::report) fn latex(&self) -> String {
        match self {
            Self::Prose(text) => text.latex(),
            _ => crate::report::latex::escape(&self.plain()),
        }
    }

    fn markdown(&self) -> String {
        match self {
            Self::Prose(text) => text.markdown(),
            Self::Verdict(verdict) => format!("{} {}", sign(*verdict), verdict.name()),
            _ => summary::escape(&self.plain()),
        }
    }

    /// Whether it is a number, which lines up with those above it.
    fn is_number(&self) -> bool {
        matches!(self, Self::Number(..) | Self::Order(_) | Self::Interval(_) | Self::Of(..))
    }

    /// What it has as data: an interval has two values.
    fn data(&self) -> Vec<Data> {
        match self {
            Self::Number(value, _) | Self::Order(value) => vec![Data::Number(*value)],
            Self::Interval(interval) => [0, 1].map(|end| Data::Number(interval.map(|interval| interval[end]))).into(),
            Self::Of(some, all) => [*some, *all].map(|count| Data::Number(Some(count as f64))).into(),
            Self::Empty | Self::Prose(_) | Self::Verdict(_) => vec![Data::Text(self.plain())],
        }
    }
}

/// An order with two decimals: `1.00`.
pub fn order_text(order: f64) -> String {
    format!("{order:.2}").replace('-', "−")
}

/// `0.98 to 1.02`.
pub fn interval_text([low, high]: [f64; 2]) -> String {
    format!("{} to {}", order_text(low), order_text(high))
}

/// A value of a file.
enum Data {
    Text(String),
    Number(Option<f64>),
}

impl Sheet {
    /// A table whose rows turn into cards on a narrow screen.
    pub fn cards(name: impl Into<String>, caption: Prose, header: impl IntoIterator<Item = Prose>) -> Self {
        let header = header.into_iter().collect();
        Self { name: name.into(), caption, header, rows: Vec::new(), for_papers: Vec::new(), is_grid: false }
    }

    /// A table of numbers that scrolls on a narrow screen.
    pub fn grid(name: impl Into<String>, caption: Prose, header: impl IntoIterator<Item = Prose>) -> Self {
        Self { is_grid: true, ..Self::cards(name, caption, header) }
    }

    /// The same, with these columns for papers too.
    pub fn for_papers(self, columns: impl IntoIterator<Item = usize>) -> Self {
        Self { for_papers: columns.into_iter().collect(), ..self }
    }

    /// The same with one more row.
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// The same with a row for each of `items`.
    pub fn rows<T, C: IntoIterator<Item = Cell>>(
        self,
        items: impl IntoIterator<Item = T>,
        cells: impl Fn(T) -> C,
    ) -> Self {
        items.into_iter().fold(self, |sheet, item| sheet.row(cells(item)))
    }

    /// Every text in it.
    pub(super) fn texts(&self) -> impl Iterator<Item = &Prose> {
        let cells =
            self.rows.iter().flatten().filter_map(|cell| if let Cell::Prose(text) = cell { Some(text) } else { None });
        [&self.caption].into_iter().chain(&self.header).chain(cells)
    }

    /// The table on a page.
    pub(in crate::report) fn to_html(&self, cited: &[&Reference]) -> Table {
        let header = self.header.iter().map(|head| (head.html(cited), head.plain()));
        let is_number = |column: &usize| self.rows.iter().any(|row| row.get(*column).is_some_and(Cell::is_number));
        let table = Table::cards_of(self.caption.html(cited), header)
            .id(format!("table-{}", self.name))
            .numbers((1..self.header.len()).filter(is_number));
        let table = if self.is_grid { table.into_grid(self.caption.plain()) } else { table };
        table.rows(&self.rows, |row| row.iter().map(|cell| cell.html(cited)).collect::<Vec<_>>())
    }

    /// Where its numbers are.
    pub(super) fn file_line(&self) -> Markup {
        html! { p.quiet { a href={ "tables/" (self.name) ".csv" } { (count(self.rows.len(), "row")) " as CSV" } "." } }
    }

    /// Its numbers with all their digits; an interval takes two columns, as does a number of a number.
    pub(super) fn to_csv(&self) -> String {
        let mut csv = String::new();
        let line = |csv: &mut String, cells: &[Data]| {
            let values: Vec<Value<'_>> = cells
                .iter()
                .map(|cell| match cell {
                    Data::Text(text) => Value::Text(text),
                    Data::Number(number) => Value::Number(*number),
                })
                .collect();
            push_line(csv, &values);
        };
        let width = |column: usize| {
            self.rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.data().len()).max().unwrap_or(1)
        };
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let heads = self.header.iter().zip(&widths).flat_map(|(head, width)| {
            let head = head.plain();
            let name = move |part: usize| match (width, part) {
                (1, _) => Data::Text(head.clone()),
                (_, part) => Data::Text(format!("{head} {}", part + 1)),
            };
            (0..*width).map(name)
        });
        line(&mut csv, &heads.collect::<Vec<_>>());
        for row in &self.rows {
            let cells = row.iter().zip(&widths).flat_map(|(cell, width)| {
                let mut data = cell.data();
                data.resize_with(*width, || Data::Text(String::new()));
                data
            });
            line(&mut csv, &cells.collect::<Vec<_>>());
        }
        csv
    }

    /// In GitHub's Markdown.
    pub(super) fn to_markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = line(self.header.iter().map(Prose::markdown).collect());
        text.push_str(&line(vec!["---".to_owned(); self.header.len()]));
        self.rows.iter().for_each(|row| text.push_str(&line(row.iter().map(Cell::markdown).collect())));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_a_file_is_as_wide_as_its_widest_cell() {
        let head = |text: &str| Prose::text(text);
        let sheet = Sheet::cards("orders", head("Orders"), ["quantity", "interval", "right"].map(head))
            .row([Cell::text("depth"), Cell::Empty, Cell::Of(3, 4)])
            .row([Cell::text("time"), Cell::Interval(Some([0.5, 1.25])), Cell::Empty]);
        let text = sheet.to_csv();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1..], ["depth,,,3,4", "time,0.5,1.25,,"], "{text}");
        assert_eq!(lines[0].split(',').count(), 5, "{text}");
    }
}
