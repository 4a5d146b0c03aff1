//! The page of a report: one builder for every kind of run. It needs no script, no network and no other file.
//!
//! A page is a text in `pages/`: sections with headings and prose as HTML, and slots for tables and figures.
//!
//! ```text
//! # id Title                   begins a section
//! #? id Title                  begins a section that is left out if none of its slots has anything to show
//! @figures events              a slot: the figures of that section of the suite
//! @results events Caption      its claims, one row a table of the suite
//! ```

use std::borrow::Cow;
use std::fmt::Write as _;

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use super::chart::Ink;
use super::figure::{self, Figure};
use super::references::{self, Reference, reference};
use super::text::{clipped, count, number, one_line};
use super::{Environment, Run, typeset};
use crate::suite::{Claim, Counts, Judged, Verdict, grouped, of_cases, tables, worst};

/// A page.
pub(super) struct Page<'a> {
    /// Its main heading.
    pub(super) title: Cow<'a, str>,
    /// What the title of its window adds to that.
    pub(super) outcome: &'a str,
    /// What it is about, in a sentence; empty where the title says it.
    pub(super) subject: Markup,
    /// One sentence beside program and date: what the report is for.
    pub(super) purpose: &'a str,
    /// Program and machine.
    pub(super) environment: &'a Environment,
    /// Its sections.
    pub(super) parts: Vec<Part<'a>>,
    /// Other files with the same numbers.
    pub(super) files: Markup,
}

/// A section of a page.
pub(super) struct Part<'a> {
    id: &'a str,
    title: &'a str,
    body: Vec<Block<'a>>,
}

/// A part of a section.
enum Block<'a> {
    /// A line of a text of `pages/`, with its citations and references as they are written there.
    Line(&'a str),
    /// What was made of the run.
    Shown(String),
    /// The works that the lines cite.
    References,
}

/// The name of the table that follows, `Table 3`: the page fills it in. No text of others can hold it, since it is markup.
pub(super) const NEXT_TABLE: PreEscaped<&str> = PreEscaped("<span class=\"next-table\"></span>");

impl<'a> Part<'a> {
    /// A section with its anchor, its heading and what stands in it.
    pub(super) fn new(id: &'a str, title: &'a str, body: Markup) -> Self {
        Self { id, title, body: vec![Block::Shown(body.into_string())] }
    }

    /// The sections of a text of `pages/` that have something to show; `slot` gives the contents of a slot, by its name and
    /// the words behind it.
    pub(super) fn of_text(text: &'a str, slot: &dyn Fn(&str, &str) -> Markup) -> Vec<Self> {
        let mut parts: Vec<(Self, bool)> = Vec::new();
        for line in text.lines() {
            if let Some(head) = line.strip_prefix('#') {
                let is_shown = !head.starts_with('?');
                let (id, title) = head.trim_start_matches(['?', ' ']).split_once(' ').unwrap_or((head, head));
                parts.push((Self { id, title, body: Vec::new() }, is_shown));
            } else if let Some((part, is_shown)) = parts.last_mut() {
                if let Some(slot_line) = line.strip_prefix('@') {
                    let (name, words) = slot_line.split_once(' ').unwrap_or((slot_line, ""));
                    let filled = slot(name, words).into_string();
                    *is_shown |= !filled.is_empty();
                    part.body.push(if name == "references" { Block::References } else { Block::Shown(filled) });
                } else {
                    part.body.push(Block::Line(line));
                }
            }
        }
        parts.into_iter().filter(|(_, is_shown)| *is_shown).map(|(part, _)| part).collect()
    }
}

/// Characters of a title in the head of each page on paper: what follows them stands in the same line.
const HEAD_MAX: usize = 60;

impl<'a> Page<'a> {
    /// The page of a judged suite.
    pub(super) fn of_run(
        run: &'a Run<'_>,
        purpose: &'a str,
        text: &'a str,
        slot: &dyn Fn(&str, &str) -> Markup,
        files: Markup,
    ) -> Self {
        let outcome = Counts::of_claims(run.judged).verdict().name();
        let title = one_line(&run.suite.title).into();
        let parts = Part::of_text(text, slot);
        Self { title, outcome, subject: html! {}, purpose, environment: &run.environment, parts, files }
    }

    /// The margins of paper: what was judged, what it came to and by which program above, the page below.
    fn margins(&self) -> String {
        let [head, program] = [
            format!("{}: {}", clipped(&self.title, HEAD_MAX), self.outcome),
            format!("penetrode {}, {}", self.environment.version, self.environment.commit),
        ]
        .map(|text| css_string(&text));
        let font = "font:9px system-ui,sans-serif;color:#5a6470";
        format!(
            "@page{{size:A4;margin:18mm 15mm 16mm;@top-left{{content:{head};{font};width:70%}}\
             @top-right{{content:{program};{font}}}\
             @bottom-right{{content:\"page \" counter(page) \" of \" counter(pages);{font}}}}}"
        )
    }

    pub(super) fn to_html(&self) -> String {
        let (e, parts) = (self.environment, &self.parts);
        let bodies = numbered(parts);
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    // The page asks for nothing; should it ever try, the browser refuses.
                    meta http-equiv="Content-Security-Policy"
                        content="default-src 'none'; style-src 'unsafe-inline'; img-src data:";
                    meta name="color-scheme" content="light dark";
                    link rel="icon" href="data:,";
                    title { (self.title) ": " (self.outcome) }
                    style { (PreEscaped(Ink::style_sheet())) (PreEscaped(include_str!("page.css"))) (PreEscaped(self.margins())) }
                }
                body {
                    @if let Some(first) = parts.first() { a.skip href={ "#" (first.id) } { "Skip to: " (first.title) } }
                    header {
                        h1 { (self.title) }
                        @if !self.subject.0.is_empty() { p.subject { (self.subject) } }
                        p.quiet {
                            "penetrode " (e.version) ", commit " code { (e.commit) } (changes(e)) ", "
                            time datetime=(e.date) { (e.date) } ". " (self.purpose)
                        }
                    }
                    main {
                        @for (index, (part, body)) in parts.iter().zip(&bodies).enumerate() {
                            section aria-labelledby=(part.id) {
                                h2 id=(part.id) { a.no href="#contents" title="to the contents" { (index + 1) } " " (typeset::html(part.title)) }
                                (PreEscaped(body))
                            }
                            @if index == 0 {
                                nav id="contents" aria-label="Contents" {
                                    ol { @for part in parts { li { a href={ "#" (part.id) } { (typeset::html(part.title)) } } } }
                                    @if bodies.iter().any(|body| body.contains("<details")) {
                                        p.unfold { input id="unfold" type="checkbox"; label for="unfold" { " Show all that is folded; the search of the browser then finds it" } }
                                    }
                                }
                            }
                        }
                        // Within what it follows: on paper it then takes the last lines along and stands on no page alone.
                        footer { "Written by penetrode " (e.version) ". The same numbers: " (self.files)
                            ", and a CSV file for each figure." }
                    }
                }
            }
        };
        page.into_string()
    }
}

/// The bodies of `parts`, whose tables and figures are numbered, and whose citations and references are links.
fn numbered(parts: &[Part<'_>]) -> Vec<String> {
    let mut anchors: Vec<(String, String)> = Vec::new();
    let (mut tables, mut figures) = (0, 0);
    let mut shown = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        anchors.push((part.id.to_owned(), format!("section {}", index + 1)));
        for block in &part.body {
            if let Block::Shown(html) = block {
                shown.push(with_numbers(html, &mut tables, &mut figures, &mut anchors));
            }
        }
    }
    let mut cited = Vec::new();
    for block in parts.iter().flat_map(|part| &part.body) {
        if let Block::Line(line) = block {
            linked(line, &anchors, &mut cited);
        }
    }
    let mut shown = shown.into_iter();
    let body = |part: &Part<'_>| {
        let mut body = String::new();
        for block in &part.body {
            match block {
                Block::Line(line) => body += &linked(line, &anchors, &mut cited),
                Block::Shown(_) => body += &shown.next().unwrap_or_default(),
                Block::References => body += &references::list(&cited).into_string(),
            }
            body.push('\n');
        }
        body
    };
    parts.iter().map(body).collect()
}

/// `html` with the numbers of its tables and figures, which go on from `tables` and `figures`; their ids and names are added to
/// `anchors`.
fn with_numbers(html: &str, tables: &mut usize, figures: &mut usize, anchors: &mut Vec<(String, String)>) -> String {
    const TABLE: &str = "<caption";
    const FIGURE: &str = "<figure id=\"";
    const MESSAGE: &str = "<figcaption><b>";
    let (mut numbered, mut rest) = (String::new(), html);
    while let Some(at) = [TABLE, FIGURE, NEXT_TABLE.0].iter().filter_map(|start| rest.find(start)).min() {
        let (before, from) = rest.split_at(at);
        numbered += before;
        if let Some(after) = from.strip_prefix(NEXT_TABLE.0) {
            numbered += &format!("Table {}", *tables + 1);
            rest = after;
            continue;
        }
        let (head, name) = if from.starts_with(TABLE) {
            *tables += 1;
            (from.find('>').map_or(from.len(), |end| end + 1), format!("Table {tables}"))
        } else {
            *figures += 1;
            (from.find(MESSAGE).map_or(from.len(), |start| start + MESSAGE.len()), format!("Figure {figures}"))
        };
        let (head, after) = from.split_at(head);
        numbered += head;
        numbered += &if head.starts_with(TABLE) { format!("<b>{name}.</b> ") } else { format!("{name}. ") };
        if let Some((id, _)) = head.split_once("id=\"").and_then(|(_, id)| id.split_once('"')) {
            anchors.push((id.to_owned(), name));
        }
        rest = after;
    }
    numbered + rest
}

/// A line of a text of `pages/`: `[@key]` cites, `[ (#anchor)]` refers to what `anchors` name, and is left out with all between its
/// brackets where that is not on the page. What is cited for the first time is added to `cited`.
fn linked(line: &str, anchors: &[(String, String)], cited: &mut Vec<&'static Reference>) -> String {
    let (mut text, mut rest) = (String::new(), line);
    while let Some((before, (inside, after))) = rest.split_once('[').and_then(|(a, b)| Some((a, b.split_once(']')?))) {
        text += before;
        rest = after;
        if let Some(keys) = inside.strip_prefix('@') {
            let works: Vec<_> = keys.split(',').filter_map(|key| reference(key.trim())).collect();
            for work in &works {
                if !cited.contains(work) {
                    cited.push(work);
                }
            }
            text += &references::citation(&works, cited).into_string();
        } else if let Some((start, from)) = inside.split_once('#') {
            let (id, end) =
                from.split_at(from.find(|c: char| !c.is_ascii_alphanumeric() && c != '-').unwrap_or(from.len()));
            if let Some((_, name)) = anchors.iter().find(|(known, _)| known == id) {
                text += &html! { (PreEscaped(start)) a href={ "#" (id) } { (name) } (PreEscaped(end)) }.into_string();
            }
        } else {
            text += &format!("[{inside}]");
        }
    }
    typeset::equations(&(text + rest))
}

/// `text` as a string of CSS inside a page, 80 characters at most: whatever could end the string or the sheet is written
/// as its number.
fn css_string(text: &str) -> String {
    let mut quoted = "\"".to_owned();
    for c in one_line(text).chars().take(80) {
        if c.is_alphanumeric() || " .,:-".contains(c) {
            quoted.push(c);
        } else {
            let _ = write!(quoted, "\\{:x} ", u32::from(c));
        }
    }
    quoted + "\""
}

/// A slot that the pages of all judged suites share; another is shown by its name, which a test excludes.
pub(super) fn slot(run: &Run<'_>, figures: &[Figure], name: &str, words: &str) -> Markup {
    let (section, caption) = words.split_once(' ').unwrap_or((words, ""));
    let section = figure::section(section);
    let claims = || tables(run.judged).filter(|claims| section.is_none_or(|of| claims[0].claim.section == of));
    match name {
        "verdict" => verdict(run.judged, words),
        "criteria" if section.is_some() => criteria(caption, &claims().collect::<Vec<_>>()),
        "criteria" => every_criterion(&claims().collect::<Vec<_>>()),
        "figures" => html! { @for shown in figures.iter().filter(|f| f.section.is_some() && f.section == section) {
            (figure(shown, &run.environment.command))
        } },
        "results" => {
            let id = words.split(' ').next().unwrap_or_default();
            results(id, caption, &claims().collect::<Vec<_>>())
        }
        "each" => {
            let each: Vec<_> = claims().flatten().collect();
            html! { @if !each.is_empty() { (folded(caption, true, claims_table("", each))) } }
        }
        "every-claim" => every_claim(run.judged),
        "reproduction" => reproduction(&run.environment, suite_inputs(&run.environment)),
        _ => html! { "@" (name) },
    }
}

/// Columns of a table whose rows need no cards on a tablet.
const CARDS_MAX: usize = 5;

/// A table: on a wide page a grid, which scrolls by itself, or cards, which a narrow screen shows row by row.
pub(super) struct Table {
    caption: Markup,
    is_grid: bool,
    /// Heads of the columns, and their names beside the cells of a narrow screen.
    header: Vec<(Markup, String)>,
    rows: Vec<Vec<Markup>>,
    numbers: Vec<usize>,
    name: String,
    id: String,
}

impl Table {
    /// A table whose rows turn into cards on a narrow screen.
    pub(super) fn cards<T: ToString>(caption: impl Into<String>, header: impl IntoIterator<Item = T>) -> Self {
        let caption: String = caption.into();
        let header = header.into_iter().map(|title| title.to_string());
        let table = Self::cards_of(typeset::html(&caption), header.map(|title| (typeset::html(&title), title)));
        Self { name: caption, ..table }
    }

    /// A table of numbers that scrolls on a narrow screen.
    pub(super) fn grid<T: ToString>(caption: impl Into<String>, header: impl IntoIterator<Item = T>) -> Self {
        let table = Self { is_grid: true, ..Self::cards(caption, header) };
        Self { numbers: (1..table.header.len()).collect(), ..table }
    }

    /// As [`Self::cards`], with words that are set: the head of each column, and its name as text.
    pub(super) fn cards_of(caption: Markup, header: impl IntoIterator<Item = (Markup, String)>) -> Self {
        let header = header.into_iter().collect();
        Self {
            caption,
            is_grid: false,
            header,
            rows: Vec::new(),
            numbers: Vec::new(),
            name: String::new(),
            id: String::new(),
        }
    }

    /// The same as a grid; `name` is read out in place of its caption.
    pub(super) fn into_grid(self, name: String) -> Self {
        Self { is_grid: true, name, ..self }
    }

    /// The same with an anchor, by which texts refer to it.
    pub(super) fn id(self, id: impl Into<String>) -> Self {
        Self { id: id.into(), ..self }
    }

    /// The same with numbers in these columns alone.
    pub(super) fn numbers(self, numbers: impl IntoIterator<Item = usize>) -> Self {
        Self { numbers: numbers.into_iter().collect(), ..self }
    }

    /// The same with one more row.
    pub(super) fn row(mut self, cells: impl IntoIterator<Item = Markup>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// The same with a row for each of `items`.
    pub(super) fn rows<T, C: IntoIterator<Item = Markup>>(
        self,
        items: impl IntoIterator<Item = T>,
        cells: impl Fn(T) -> C,
    ) -> Self {
        items.into_iter().fold(self, |table, item| table.row(cells(item)))
    }
}

impl Render for Table {
    fn render(&self) -> Markup {
        let table = html! {
            table.(if self.is_grid { "grid" } else { "cards" }).wide[!self.is_grid && self.header.len() > CARDS_MAX] {
                @if !self.caption.0.is_empty() { caption id=[Some(&self.id).filter(|id| !id.is_empty())] { (self.caption) "." } }
                thead { tr { @for (title, _) in &self.header { th scope="col" { (title) } } } }
                tbody { @for row in &self.rows { tr {
                    @for (index, cell) in row.iter().enumerate() {
                        @if index == 0 { th scope="row" { (cell) } }
                        @else { td.num[self.numbers.contains(&index)] data-label=(self.header.get(index).map_or("", |(_, name)| name)) { (cell) } }
                    }
                } } }
            }
        };
        if !self.is_grid {
            return table;
        }
        html! { div.scroll tabindex="0" role="region" aria-label=(self.name) { (table) } }
    }
}

/// Text as a cell.
#[expect(clippy::needless_pass_by_value, reason = "every caller makes it in place")]
pub(super) fn cell(text: impl ToString) -> Markup {
    html! { (one_line(&text.to_string())) }
}

/// A number with `digits` digits as a cell, a dash where there is none.
pub(super) fn number_cell(value: Option<f64>, digits: usize) -> Markup {
    html! { (value.map_or_else(|| "—".to_owned(), |value| number(value, digits))) }
}

/// A part that is folded until somebody opens it; one that is `long` stays folded on paper.
pub(super) fn folded(summary: impl Render, long: bool, body: impl Render) -> Markup {
    html! { details.long[long] { summary { (summary) } (body) } }
}

/// Names and what is said of each.
pub(super) fn facts<'t>(facts: impl IntoIterator<Item = (&'t str, Markup)>) -> Markup {
    html! { dl.facts { @for (name, fact) in facts { dt { (typeset::html(name)) } dd { (fact) } } } }
}

pub(super) fn sign(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "✓",
        Verdict::Failed => "✗",
        Verdict::Undecided => "?",
        Verdict::Skipped => "–",
    }
}

/// Verdict of a group of claims, and how many came to what.
pub(super) fn counts_cell(counts: Counts) -> Markup {
    html! { (badge(counts.of_group())) br; span.quiet { (tally(counts)) } }
}

/// A verdict with its sign.
pub(super) fn badge(verdict: Verdict) -> Markup {
    html! { span.badge.(verdict.name()) { (sign(verdict)) " " (verdict.name()) } }
}

/// `12 passed, 3 skipped`.
pub(super) fn tally(counts: Counts) -> String {
    let parts = counts.each().into_iter().filter(|(_, number)| *number > 0);
    parts.map(|(verdict, number)| format!("{number} {}", verdict.name())).collect::<Vec<_>>().join(", ")
}

/// Claims shown in the verdict section at most.
const FIRST_SCREEN: usize = 6;

/// The verdict in large letters with its meaning, how many of `noun` came to what, and those that did not pass.
fn verdict(judged: &[Judged], noun: &str) -> Markup {
    let counts = Counts::of_claims(judged);
    let verdict = counts.verdict();
    let decided = counts.passed + counts.failed + counts.undecided;
    let meaning = match verdict {
        Verdict::Passed => format!("All {decided} {noun} that apply hold within their limits."),
        Verdict::Failed => format!("{} of {decided} {noun} that apply do not hold.", counts.failed),
        Verdict::Undecided if decided == 0 => "Nothing was decided, so nothing was shown.".to_owned(),
        Verdict::Undecided => format!("{} of {decided} {noun} that apply could not be decided.", counts.undecided),
        Verdict::Skipped => String::new(),
    };
    let mut open: Vec<_> = judged.iter().filter(|j| j.is_open()).collect();
    open.sort_by_key(|j| std::cmp::Reverse(j.verdict));
    let [failed, undecided, passed, skipped] = counts.each();
    html! {
        div.verdict.(verdict.name()) {
            span.word { (sign(verdict)) " " (verdict.name()) }
            span.sum { (meaning) }
        }
        ul.counts {
            @for (verdict, number) in [passed, failed, undecided, skipped] {
                li.(verdict.name()) { b { (number) } (verdict.name()) }
            }
        }
        @if !open.is_empty() {
            (claims_table(&format!("The {noun} that failed or are undecided"), open.iter().copied().take(FIRST_SCREEN)))
            @match open.len().saturating_sub(FIRST_SCREEN) {
                0 => {}
                1 => { p { "1 more is below." } }
                more => { p { (more) " more are below." } }
            }
        }
    }
}

/// Limit of a claim with its unit.
fn limit_of(claim: &Claim) -> Markup {
    html! { (number(claim.limit, 3)) " " (claim.unit_in_words()) }
}

/// A measured value; a number of things with the number of cases that it is of.
fn measured_cell(value: Option<f64>, cases: Option<usize>) -> Markup {
    html! { (number_cell(value, 3)) @if value.is_some() && let Some(cases) = cases { span.quiet { " in " (count(cases, "case")) } } }
}

/// The anchor of a claim, or of the first claim of a table, among all claims.
fn anchor(kind: &str, id: &str) -> String {
    format!("{kind}-{}", one_line(id).replace(' ', "_"))
}

/// One row a claim, whose name leads to its place among all claims; the statement stands with the first of its table.
pub(super) fn claims_table<'a>(caption: &str, judged: impl IntoIterator<Item = &'a Judged>) -> Table {
    claims_rows(caption, judged, |claim, _| {
        html! {
            a href={ "#" (anchor("claim", &claim.id)) } { code { (one_line(&claim.id)) } }
        }
    })
}

/// One row a claim, whose name is shown by `name`, which is given whether it is the first of its table.
fn claims_rows<'a>(
    caption: &str,
    judged: impl IntoIterator<Item = &'a Judged>,
    name: fn(&Claim, bool) -> Markup,
) -> Table {
    let mut table = Table::cards(caption, ["claim", "verdict", "measured", "limit", "what was seen"]).numbers(2..3);
    let mut last = "";
    for judged in judged {
        let claim = &judged.claim;
        let is_first = std::mem::replace(&mut last, &claim.table) != claim.table;
        table = table.row([
            html! { (name(claim, is_first)) @if is_first { br; (typeset::html(&claim.statement)) } },
            badge(judged.verdict),
            measured_cell(judged.measured, of_cases([judged])),
            limit_of(claim),
            typeset::html(&judged.remark),
        ]);
    }
    table
}

/// What the claims of a table of the suite have in common.
fn head_of(claim: &Claim) -> Markup {
    html! { code { (one_line(&claim.table)) } br; (typeset::html(&claim.statement)) }
}

/// One row a table of the suite; a sentence where there are none.
fn results(section: &str, caption: &str, tables: &[&[Judged]]) -> Markup {
    let table = Table::cards(caption, ["claims", "verdict", "worst measured", "limit"]);
    let table = table.id(format!("table-{section}")).numbers(2..3).rows(tables, |claims| {
        let claim = &claims[0].claim;
        [
            head_of(claim),
            counts_cell(Counts::of_claims(*claims)),
            measured_cell(worst(claims), of_cases(*claims)),
            limit_of(claim),
        ]
    });
    html! { @if tables.is_empty() { p { "This suite claims nothing of this kind." } } @else { (table) } }
}

/// The limits of tables of the suite and their reasons.
fn criteria(heading: &str, tables: &[&[Judged]]) -> Markup {
    let rows = Table::cards("", ["claim", "limit", "why this limit"]).rows(tables, |claims| {
        let claim = &claims[0].claim;
        [head_of(claim), limit_of(claim), typeset::html(&claim.reason)]
    });
    let number = count(tables.len(), "criterion").replace("criterions", "criteria");
    folded(html! { (one_line(heading)) " (" (number) ")" }, false, rows)
}

/// The criteria of a suite, by the first part of their ids.
fn every_criterion(tables: &[&[Judged]]) -> Markup {
    let groups = grouped(tables.iter().copied(), |table| table[0].claim.group());
    html! { div.groups { @for (name, group) in &groups { (criteria(name, group)) } } }
}

/// Every claim, by the first part of the ids.
fn every_claim(judged: &[Judged]) -> Markup {
    html! { div.groups { @for (group, claims) in grouped(judged, |judged| judged.claim.group()) {
        @let name = one_line(group);
        (folded(
            html! { (name) ": " (tally(Counts::of_claims(claims.iter().copied()))) },
            true,
            claims_rows(&format!("Claims of `{name}`"), claims, |claim, is_first| html! {
                @if is_first { span id=(anchor("claims", &claim.table)) {} }
                code id=(anchor("claim", &claim.id)) { (one_line(&claim.id)) }
            }),
        ))
    } } }
}

/// A figure with its message, how to read it, the claims that judge it and the command that remakes
/// them, and its files.
pub(super) fn figure(figure: &Figure, command: &str) -> Markup {
    const NAMED: usize = 3;
    let is_whole = command.starts_with("penetrode verify") && !command.contains("--only");
    html! {
        figure id={ "figure-" (figure.name) } {
            figcaption {
                b { (typeset::html(&figure.message)) }
                (typeset::html(&figure.reading)) " "
                span.quiet {
                    @if let Some(first) = figure.claims.first() {
                        "Judged by "
                        @for (index, id) in figure.claims.iter().take(NAMED).enumerate() {
                            @if index > 0 { ", " }
                            a href={ "#" (anchor("claims", id)) } { code { (one_line(id)) } }
                        }
                        @if figure.claims.len() > NAMED { " and " (figure.claims.len() - NAMED) " more" }
                        "; remade by " code { (unbroken(command)) @if is_whole { " " (unbroken(&format!("--only {first}"))) } } ". "
                    }
                    a href={ "tables/" (figure.name) ".csv" } { (count(figure.table().lines().count() - 1, "row")) " as CSV" } ", "
                    a href={ "figures/" (figure.name) ".svg" } { "figure as SVG" } "."
                }
            }
            @for index in 0..figure.panels.len() { (PreEscaped(figure.inline(index))) }
        }
    }
}

/// A command on one line of a text: no option is broken behind its hyphens.
fn unbroken(command: &str) -> Markup {
    let command = one_line(command);
    html! { @for (index, word) in command.split(' ').enumerate() {
        @if index > 0 { " " }
        @if word.starts_with("--") { span.num { (word) } } @else { (word) }
    } }
}

/// The command that remakes a run, what went into it, and what it ran on.
pub(super) fn reproduction<'t>(e: &'t Environment, inputs: impl IntoIterator<Item = (&'t str, Markup)>) -> Markup {
    let features = if e.features.is_empty() { "none".to_owned() } else { e.features.join(", ") };
    let mut list = vec![
        (
            "Program",
            html! {
                "penetrode " (e.version) ", commit " code { (e.commit) } (changes(e)) @if e.tree == "clean" { ", unchanged" }
            },
        ),
        ("Built by", html! { (e.rustc) ", profile " (e.profile) ", optimisation " (e.opt_level) ", for " (e.target) }),
        ("Flags of the compiler", html! { code { (one_line(e.rustflags)) } }),
        ("Features", cell(features)),
        ("Processor features used", cell(e.target_features.replace(',', ", "))),
        ("Operating system", html! { (one_line(&e.os)) ", " (one_line(&e.kernel)) }),
        ("C library", html! { (one_line(&e.libc)) ", with the elementary functions" }),
        ("Processor", html! { (one_line(&e.cpu)) ", " (count(e.threads, "thread")) }),
        ("Floating point", cell(&e.floating_point)),
        ("Lock file (BLAKE3)", html! { code { (e.lock_file_hash) } }),
    ];
    list.extend(inputs);
    list.extend(e.peers.iter().map(|(name, text)| (name.as_str(), typeset::html(text))));
    list.push(("Date", html! { time datetime=(e.date) { (e.date) } }));
    html! { pre { code { (one_line(&e.command)) } } (facts(list)) }
}

/// What stands behind a commit that was not all that was built.
fn changes(e: &Environment) -> Markup {
    html! { @if e.tree == "changed" { " " b { "and changes since" } } }
}

/// What goes into a run of scenes.
pub(super) fn suite_inputs(e: &Environment) -> Vec<(&'static str, Markup)> {
    let code = |text: &str| html! { code { (text) } };
    let mut list = vec![("Seed", cell(e.seed))];
    list.extend(e.suite_hash.iter().map(|hash| ("Suite (BLAKE3)", code(hash))));
    list.push(("Scenes (BLAKE3)", code(&e.scenes_hash)));
    list
}

#[cfg(test)]
mod tests {
    use super::{NEXT_TABLE, css_string, linked, with_numbers};

    #[test]
    fn tables_and_figures_are_numbered_in_their_order_and_found_by_their_anchors() {
        let (mut tables, mut figures, mut anchors) = (1, 0, Vec::new());
        let html = format!(
            "{}: a<caption id=\"table-x\">X</caption><caption>&lt;caption&gt;</caption><figure id=\"figure-y\"><figcaption><b>Y",
            NEXT_TABLE.0
        );
        let numbered = with_numbers(&html, &mut tables, &mut figures, &mut anchors);
        assert_eq!(
            numbered,
            "Table 2: a<caption id=\"table-x\"><b>Table 2.</b> X</caption><caption><b>Table 3.</b> &lt;caption&gt;</caption><figure \
             id=\"figure-y\"><figcaption><b>Figure 1. Y"
        );
        assert_eq!((tables, figures), (3, 1));
        let names: Vec<_> = anchors.iter().map(|(id, name)| (id.as_str(), name.as_str())).collect();
        assert_eq!(names, [("table-x", "Table 2"), ("figure-y", "Figure 1")]);
    }

    #[test]
    fn texts_refer_to_what_is_on_the_page_and_say_nothing_of_the_rest() {
        let anchors = [("table-x".to_owned(), "Table 2".to_owned())];
        let mut cited = Vec::new();
        let line = "is so[ (#table-x)][ and #figure-y too] [@celik2008] [0, 1]";
        assert_eq!(
            linked(line, &anchors, &mut cited),
            "is so (<a href=\"#table-x\">Table 2</a>) [<a href=\"#ref-celik2008\">1</a>] [0, 1]"
        );
        assert_eq!(cited.len(), 1);
    }

    /// A key that no work has would be left out without a word.
    #[test]
    fn every_citation_of_the_texts_is_a_work() {
        let texts =
            [include_str!("pages/verify.txt"), include_str!("pages/stress.txt"), include_str!("pages/bench.txt")];
        for key in texts.iter().flat_map(|text| text.split("[@").skip(1)).filter_map(|rest| rest.split(']').next()) {
            for key in key.split(',') {
                assert!(super::reference(key.trim()).is_some(), "{key}");
            }
        }
    }

    #[test]
    fn nothing_ends_a_string_of_the_style_sheet() {
        assert_eq!(css_string("a \"b\\</style>"), r#""a \22 b\5c \3c \2f style\3e ""#);
        assert_eq!(css_string(&"\u{202e}x".repeat(200)).matches('x').count(), 40);
    }
}
