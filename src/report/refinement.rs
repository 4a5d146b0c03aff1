//! The report of a study of step sizes or tolerances: of a table (`audit`), or of a scheme on a scene (`converge`).

use std::fmt::Display;

use super::Environment;
use super::chart::{Axis, Ink, Panel, Style, extremes};
use super::figure::{Figure, name_of};
use super::junit::Case;
use super::study::{Cell, Element, Headline, PROVED, Prose, Section, Sheet, StudyReport, interval_text, order_text};
use super::text::{count, number, prefixed};
use crate::integrators::Flight;
use crate::physics::{Problem, Scene};
use crate::studies::audit::{Audit, AuditPoint, ErrorBand, QuantityAudit};
use crate::studies::diagnosis::{Content, contents};
use crate::studies::error::compare;
use crate::studies::grid_convergence::{ThreeGrids, Uncertainty};
use crate::studies::order::Exclusion;
use crate::studies::{Quantity, Verdict};
use crate::text::digits_between;

/// Points of a series that are drawn at most; all of them are in the JSON.
const DRAWN_MAX: usize = 400;

/// Reference slopes pass through so many times the error of the coarsest point.
const SLOPES_ABOVE: f64 = 6.0;

/// Values are drawn up to so many times the finest size of the fit, where there are so many of them.
const DECADE: f64 = 10.0;
const FEW: usize = 4;

/// Rows listed on the page at most.
const LISTED_MAX: usize = 600;

/// What a cell of the classical table holds.
type Get<'g> = &'g dyn Fn(&Series, &ThreeGrids) -> Cell;

/// What is refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// A time step (s).
    Step,
    /// A relative tolerance.
    Tolerance,
}

impl Size {
    fn symbol(self) -> Prose {
        match self {
            Self::Step => "{Δt}".into(),
            Self::Tolerance => "rtol".into(),
        }
    }

    fn noun(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Tolerance => "tolerance",
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Step => "s",
            Self::Tolerance => "",
        }
    }

    /// `Δt = 0.5 µs`.
    fn at(self, size: f64) -> Prose {
        let value = shown(size, 3, self.unit());
        match self {
            Self::Step => Prose::new("{Δt} = {0}", &[&value]),
            Self::Tolerance => Prose::new("rtol = {0}", &[&value]),
        }
    }
}

/// What was refined, and what was found.
#[derive(Clone, Debug)]
pub struct Refinement {
    /// Name of the user's table or scheme.
    pub title: String,
    /// What was judged and against what, in a sentence.
    pub subject: Prose,
    /// What is refined.
    pub size: Size,
    /// What it came to.
    pub verdict: Verdict,
    /// The quantities, in the order of the command.
    pub series: Vec<Series>,
    /// The method in words.
    pub method: String,
    /// What the path of the scene meets; `None` where there is no scene.
    pub path: Option<PathMet>,
    /// What was judged, and how: names and facts.
    pub judged: Vec<(&'static str, String)>,
    /// What is to be said besides.
    pub remarks: Vec<Prose>,
    /// Where it ran, and what remakes it.
    pub environment: Environment,
    /// What went in: names and hashes.
    pub inputs: Vec<(&'static str, String)>,
}

/// What the path of a scene meets.
#[derive(Clone, Debug)]
pub struct PathMet {
    /// Up to its end.
    whole: Vec<Content>,
    /// Up to x = k d.
    to_crater_end: Vec<Content>,
}

impl PathMet {
    /// What the flight `exact` through `problem`, that of `scene`, meets.
    pub fn of(problem: &Problem, scene: &Scene, exact: &Flight) -> Self {
        let whole = contents(problem, Some(scene), exact);
        let first = contents(problem, Some(scene), &Flight { stage: 0, ..exact.clone() });
        let has_come = |content: &Content| Content::TERMS.contains(content) || *content == Content::StageEnd;
        let stage_end = whole.iter().filter(|content| **content == Content::StageEnd);
        let to_crater_end = first.iter().filter(|content| has_come(content)).chain(stage_end).copied().collect();
        Self { whole, to_crater_end }
    }

    /// Whether the path has met it where the quantity of this name is taken.
    fn meets(&self, quantity: &str, content: Content) -> bool {
        let is_early =
            [Quantity::CraterEndTime, Quantity::CraterEndVelocity].map(words_of).iter().any(|name| name == quantity);
        if is_early { &self.to_crater_end } else { &self.whole }.contains(&content)
    }
}

/// One quantity.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name.
    pub name: String,
    /// Unit of its values; empty where none is known.
    pub unit: &'static str,
    /// What it came to.
    pub verdict: Verdict,
    /// What the values do.
    pub class: &'static str,
    /// Why, in a clause.
    pub reason: String,
    /// What would decide it.
    pub advice: Option<String>,
    /// Two numbers between which the exact value is proved to lie.
    pub proved: Option<(f64, f64)>,
    /// Order expected.
    pub formal_order: Option<f64>,
    /// Order found.
    pub observed_order: Option<f64>,
    /// Its 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Constant C of the relative error `C h^p`.
    pub error_constant: Option<f64>,
    /// Whether the scene fixes it, whatever the step.
    pub fixed: bool,
    /// Limit for h → 0.
    pub limit: Option<f64>,
    /// Exact value.
    pub exact: Option<f64>,
    /// Whether the values tend to it.
    pub agrees: bool,
    /// Relative error of the finest value, where an exact one is known.
    pub relative_error: Option<f64>,
    /// What that is relative to.
    pub relative_to: &'static str,
    /// Whether the errors of the points are against the exact value, and not against the limit of the values.
    pub is_against_exact: bool,
    /// The error bar of the value that it belongs to: step and value.
    pub finest: Option<(f64, f64)>,
    /// That error bar.
    pub error_band: Option<ErrorBand>,
    /// Error bars by published rules.
    pub error_bands: Vec<Uncertainty>,
    /// The classical table.
    pub three_grids: Option<ThreeGrids>,
    /// Every size, ascending.
    pub points: Vec<SeriesPoint>,
}

/// One size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesPoint {
    /// Step or tolerance.
    pub size: f64,
    /// Value.
    pub value: f64,
    /// Size of its relative error, where one is known.
    pub error: Option<f64>,
    /// Whether the order rests on it.
    pub used: bool,
    /// Why not.
    pub excluded: Option<Exclusion>,
}

impl Series {
    /// A column of a table.
    fn of_audit(audit: &QuantityAudit) -> Self {
        let mut points: Vec<SeriesPoint> = audit
            .points
            .iter()
            .map(|&AuditPoint { dt_s: size, value, error, used, excluded }| SeriesPoint {
                size,
                value,
                error,
                used,
                excluded,
            })
            .collect();
        points.sort_by(|a, b| a.size.total_cmp(&b.size));
        Self {
            name: audit.quantity.quantity().map_or_else(|| audit.quantity.name().to_owned(), words_of),
            unit: audit.quantity.quantity().map_or("", |quantity| quantity.unit()),
            verdict: audit.verdict,
            class: audit.class.name(),
            reason: audit.reason.clone(),
            proved: audit.proved,
            advice: audit.advice.clone(),
            formal_order: audit.formal_order,
            observed_order: audit.observed_order,
            interval: audit.interval,
            error_constant: audit.error_constant,
            fixed: audit.fixed,
            limit: audit.limit,
            exact: audit.exact,
            agrees: audit.agrees_with_exact == Some(true),
            relative_error: audit.relative_error,
            relative_to: audit.quantity.quantity().map_or("the exact value", relative_to),
            // Where the limit is another than the exact value, the errors are those against the limit.
            is_against_exact: audit.relative_error.is_some()
                && audit.relative_error == audit.points.first().and_then(|point| point.error),
            finest: Some((audit.finest.dt_s, audit.finest.value)),
            error_band: audit.error_band,
            error_bands: audit.error_bands.clone(),
            three_grids: audit.three_grids,
            points,
        }
    }

    /// Name with the unit.
    fn head(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) }
    }

    /// Half-width of the error bar over the value.
    fn relative_band(&self) -> Option<f64> {
        let share = (self.error_band?.half_width / self.finest?.1).abs();
        share.is_finite().then_some(share)
    }

    /// Digits of a value that its error bar leaves.
    fn digits(&self) -> usize {
        self.relative_band().filter(|share| *share > 0.0).map_or(6, |share| {
            let digits = (1.0 / share).log10().ceil() + 2.0;
            digits.clamp(4.0, 15.0) as usize
        })
    }

    /// The value at the finest size with its unit.
    fn finest_text(&self) -> String {
        self.finest.map_or_else(|| "—".to_owned(), |(_, value)| with_unit(&number(value, self.digits()), self.unit))
    }

    /// One point in so many is drawn.
    fn thinned(&self) -> usize {
        self.points.len().div_ceil(DRAWN_MAX).max(1)
    }

    /// The points that are drawn.
    fn drawn(&self) -> impl Iterator<Item = &SeriesPoint> {
        self.points.iter().step_by(self.thinned())
    }
}

/// What errors of `quantity` are relative to.
pub fn relative_to(quantity: Quantity) -> &'static str {
    if quantity.is_over_impact_speed() { "the impact velocity" } else { "the exact value" }
}

/// `136.5 m/s`.
fn with_unit(number: &str, unit: &str) -> String {
    if unit.is_empty() { number.to_owned() } else { format!("{number}\u{a0}{unit}") }
}

/// `value` with so many digits and a prefix of its unit; without a unit in powers of ten.
fn shown(value: f64, digits: usize, unit: &str) -> String {
    // `kg`, `m/s` and the like take no prefix here.
    if !["s", "m"].contains(&unit) {
        return with_unit(&number(value, digits), unit);
    }
    let (number, prefix) = prefixed(value, digits);
    format!("{number}\u{a0}{prefix}{unit}").replace('-', "−")
}

fn quantities(number: usize) -> String {
    if number == 1 { "quantity".to_owned() } else { format!("{number} quantities") }
}

impl Refinement {
    /// The audit of a table; `file` is its name, `scene` that of the scene that it was judged by, and what its path meets.
    pub fn of_audit(
        audit: &Audit,
        file: &str,
        scene: Option<(&str, PathMet)>,
        environment: Environment,
        inputs: Vec<(&'static str, String)>,
    ) -> Self {
        let series: Vec<Series> = audit.quantities.iter().map(Series::of_audit).collect();
        let steps = series.first().map_or(0, |series| series.points.len());
        let (scene, path) = scene.unzip();
        let against = scene.map_or("nothing exact is known of them".to_owned(), str::to_owned);
        let subject = match scene {
            Some(scene) => Prose::new(
                "Solution verification of the {1} in `{0}` over {2}, against the exact solution of `{3}`.",
                &[&file, &quantities(series.len()), &count(steps, "step size"), &scene],
            ),
            None => Prose::new(
                "Solution verification of the {1} in `{0}` over {2}; no exact values are given.",
                &[&file, &quantities(series.len()), &count(steps, "step size")],
            ),
        };
        let mut judged = vec![("Table", file.to_owned()), ("Exact values", against)];
        let orders: Vec<String> = series
            .iter()
            .filter_map(|series| Some(format!("{} {}", series.name, number(series.formal_order?, 3))))
            .collect();
        judged.push(("Orders expected", if orders.is_empty() { "none given".to_owned() } else { orders.join(", ") }));
        if let Some(scheme) = &audit.scheme {
            judged.push(("Scheme", scheme.sentence()));
        }
        let notes = audit.findings.iter().filter(|finding| finding.quantity.is_none());
        let remarks = notes.map(|finding| Prose::text(format!("Note: {}.", finding.message))).collect();
        Self {
            title: file.to_owned(),
            subject,
            size: Size::Step,
            verdict: audit.verdict,
            series,
            method: format!("the code behind {file}"),
            path,
            judged,
            remarks,
            environment,
            inputs,
        }
    }

    /// The report.
    pub fn report(&self) -> StudyReport {
        let mut sections = vec![
            Section { id: "result", title: "Result", parts: self.result_parts() },
            Section { id: "judged", title: "What was judged, and how", parts: self.judged_parts() },
            Section { id: "convergence", title: "Convergence", parts: self.figures() },
            Section { id: "coverage", title: "What was asked, and what passed", parts: self.coverage() },
            Section { id: "grids", title: "The classical table of three grids", parts: self.classical() },
            Section { id: "uncertainty", title: "Numerical uncertainty", parts: self.uncertainty() },
            Section { id: "rows", title: "Every size", parts: self.every_size() },
        ];
        sections.retain(|section| !section.parts.is_empty());
        StudyReport {
            title: self.title.clone(),
            subject: self.subject.clone(),
            verdict: self.verdict,
            meaning: self.meaning(),
            headline: self.headline(),
            sections,
            cases: self.cases(),
            environment: self.environment.clone(),
            inputs: self.inputs.clone(),
        }
    }

    /// The first quantity whose verdict is that of the whole.
    fn decisive(&self) -> Option<&Series> {
        self.series.iter().find(|series| series.verdict == self.verdict)
    }

    /// Why the verdict is what it is.
    fn meaning(&self) -> Prose {
        let all = self.series.len();
        let open = self.series.iter().filter(|series| series.verdict == self.verdict).count();
        let of_all = if all == 1 { "The quantity".to_owned() } else { format!("{open} of {all} quantities") };
        match self.verdict {
            Verdict::Passed => {
                // The order of an adaptive method decides nothing: a controller holds the error of a step, not of the flight.
                let is_expected = |series: &Series| series.formal_order.is_some() && self.size == Size::Step;
                let many = |holds: &dyn Fn(&Series) -> bool| self.series.iter().filter(|series| holds(series)).count();
                let said = [
                    (many(&|series| series.observed_order.is_some() && is_expected(series)), "of the order expected"),
                    (many(&|series| series.observed_order.is_some() && !is_expected(series)), "converging"),
                    (many(&|series| series.agrees && !series.fixed), "with the exact value as limit for small steps"),
                    (many(&|series| series.fixed), "fixed by the scene and met"),
                ];
                let said = said.into_iter().filter(|(many, _)| *many > 0).map(|(many, what)| format!("{many} {what}"));
                let all =
                    if all == 1 { "The quantity passes".to_owned() } else { format!("All {all} quantities pass") };
                Prose::new("{0}: {1}.", &[&all, &said.collect::<Vec<_>>().join(", ")])
            }
            Verdict::Skipped => Prose::default(),
            Verdict::Failed | Verdict::Undecided => {
                let verb = match (self.verdict, open) {
                    (Verdict::Failed, 1) => "fails",
                    (Verdict::Failed, _) => "fail",
                    _ => "cannot be decided",
                };
                let first =
                    self.decisive().map_or(String::new(), |series| format!("{}: {}", series.name, series.reason));
                Prose::new("{0} {1}. ", &[&of_all, &verb]).then(Prose::said(first + "."))
            }
        }
    }

    fn headline(&self) -> Vec<Headline> {
        let free = |series: &&Series| !series.fixed;
        let passed = self.series.iter().filter(|series| series.verdict == Verdict::Passed).count();
        // What is no number is worse than any error.
        let is_number = |series: &Series| series.finest.is_some_and(|(_, value)| value.is_finite());
        let error = |series: &Series| if is_number(series) { series.relative_error } else { Some(f64::NAN) };
        let errors = self.series.iter().filter_map(|series| Some((series, error(series)?)));
        let largest = errors.max_by(|a, b| compare(a.1, b.1));
        let finest = |series: &Series| series.finest.map_or_else(Prose::default, |(size, _)| self.size.at(size));
        let label = "Largest error on the finest step";
        let label = if self.size == Size::Step { label } else { "Largest error at the tightest tolerance" };
        let error = match largest {
            Some((series, error)) => {
                let relative =
                    if error.is_nan() { String::new() } else { format!(", relative to {}", series.relative_to) };
                Headline {
                    label,
                    value: number(error, 2),
                    note: Prose::new("of {0}{1}, at ", &[&series.name, &relative]).then(finest(series)),
                }
            }
            None => Headline { label, value: "not known".to_owned(), note: "no exact value is known".into() },
        };
        let orders = self.series.iter().filter(free).filter_map(|series| Some((series, series.observed_order?)));
        let order = match orders.clone().min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((series, order)) => {
                let interval = series
                    .interval
                    .map_or(String::new(), |interval| format!(", 95\u{a0}% interval {}", interval_text(interval)));
                let lowest = if orders.count() > 1 { "lowest, of " } else { "of " };
                let formal = series.formal_order.map_or(String::new(), |formal| match self.size {
                    Size::Step => format!("; {} is expected", order_text(formal)),
                    Size::Tolerance => format!("; {} is in proportion", order_text(formal)),
                });
                Headline {
                    label: "Observed order",
                    value: order_text(order),
                    note: Prose::new("{0}{1}{2}{3}", &[&lowest, &series.name, &interval, &formal]),
                }
            }
            None => Headline { label: "Observed order", value: "none".to_owned(), note: "the table shows none".into() },
        };
        let bands = self.series.iter().filter(free).filter_map(|series| Some((series, series.relative_band()?)));
        let band = match bands.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((series, share)) => Headline {
                label: "Error band",
                value: format!("± {}\u{a0}%", number(100.0 * share, 2)),
                note: Prose::new(
                    "widest, of {0}: {1} ± {2}",
                    &[
                        &series.name,
                        &series.finest_text(),
                        &with_unit(&number(series.error_band.map_or(0.0, |band| band.half_width), 2), series.unit),
                    ],
                ),
            },
            None => Headline { label: "Error band", value: "none".to_owned(), note: "no rule gives one".into() },
        };
        let all = Headline {
            label: "Quantities passed",
            value: format!("{passed} of {}", self.series.len()),
            note: Prose::default(),
        };
        vec![error, order, band, all]
    }

    /// Quantity by quantity: what is read first.
    fn results(&self) -> Sheet {
        let expected = if self.size == Size::Step { "expected" } else { "in proportion" };
        let header = [
            "quantity",
            "verdict",
            "finest value",
            "±",
            "relative error",
            "order",
            "95 % interval",
            expected,
            "proved",
        ];
        let has_proof = self.series.iter().any(|series| series.proved.is_some());
        let columns = header.len() - usize::from(!has_proof);
        let header = header.into_iter().take(columns).map(Prose::from);
        // Verdicts and reasons belong to the page.
        let sheet = Sheet::cards("results", "Result by quantity".into(), header).for_papers(2..7);
        sheet.rows(&self.series, |series| {
            let cells = [
                Cell::text(series.head()),
                Cell::Verdict(series.verdict),
                Cell::Number(series.finest.map(|(_, value)| value), series.digits()),
                Cell::Number(series.error_band.map(|band| band.half_width), 2),
                Cell::Number(series.relative_error, 2),
                Cell::Order(series.observed_order),
                Cell::Interval(series.interval),
                Cell::Order(series.formal_order),
                Cell::text(series.proved.map_or_else(String::new, |(low, high)| digits_between(low, high))),
            ];
            cells.into_iter().take(columns).collect::<Vec<_>>()
        })
    }

    /// The table of results, and why what did not pass did not: a pass needs no reason, and that of the first stands beside the
    /// verdict.
    fn result_parts(&self) -> Vec<Element> {
        let mut parts = vec![Element::Table(self.results())];
        if self.series.iter().any(|series| series.proved.is_some()) {
            parts.push(Element::Text(PROVED.into()));
        }
        let first = self.decisive().map(|series| &series.name);
        for series in self.series.iter().filter(|series| series.verdict != Verdict::Passed) {
            let reason = (Some(&series.name) != first).then(|| format!("{}.", series.reason));
            let advice = series.advice.as_ref().map(|advice| format!("To decide it: {advice}."));
            let said: Vec<String> = [reason, advice].into_iter().flatten().collect();
            if !said.is_empty() {
                let gaps: [&dyn Display; 2] = [&series.name, &series.verdict.name()];
                parts.push(Element::Text(Prose::new("`{0}`, {1}: ", &gaps).then(Prose::said(said.join(" ")))));
            }
        }
        parts
    }

    /// The terms of the force and the events that the path meets against the quantities that were asked for.
    fn coverage(&self) -> Vec<Element> {
        let Some(path) = &self.path else { return Vec::new() };
        let header =
            ["the path meets".to_owned()].into_iter().chain(self.series.iter().map(|series| series.name.clone()));
        let caption = Prose::new("Terms of the force and events against quantities, by {0}", &[&self.method]);
        let sheet = Sheet::grid("coverage", caption, header.map(Prose::text)).for_papers(1..=self.series.len());
        let of = |series: &Series, content: Content| {
            let is_met = path.meets(&series.name, content);
            Cell::Of(usize::from(is_met && series.verdict == Verdict::Passed), usize::from(is_met))
        };
        let sheet = sheet.rows(&path.whole, |content| {
            let cells = self.series.iter().map(|series| of(series, *content));
            [Cell::text(content.words())].into_iter().chain(cells).collect::<Vec<_>>()
        });
        let all = Content::TERMS.into_iter().chain(Content::EVENTS);
        let others: Vec<_> = all.filter(|content| !path.whole.contains(content)).map(Content::words).collect();
        vec![
            Element::Table(sheet),
            Element::Text(
                "Each number is how many passed of those that were asked. A dash: the quantity is taken where the path has not met \
                 it yet."
                    .into(),
            ),
            Element::Text(Prose::new("The path does not meet, and nothing is shown of: {0}.", &[&others.join(", ")])),
        ]
    }

    fn judged_parts(&self) -> Vec<Element> {
        let facts = self.judged.iter().map(|(name, fact)| (*name, Prose::said(fact)));
        let mut parts = vec![Element::Facts(facts.collect())];
        parts.push(Element::Text(match self.size {
            Size::Step => "Verification asks whether the equations are solved right, by refinement of the step \
                           [@asme2019, aiaa1998, oberkampf2010]. With {h} for the step, values follow \
                           {f} = {f_0} + {C} {h^p} where steps are small enough; the order {p} is fitted to all \
                           sizes that follow one power, with an interval, and a verdict rests on that interval and not on \
                           three grids alone."
                .into(),
            Size::Tolerance => "Verification asks whether the equations are solved right [@asme2019, aiaa1998, oberkampf2010]. \
                                An adaptive method is asked at many relative tolerances; its error must fall with \
                                them. An order of 1 is in proportion; a controller holds the error of a step and not that of the \
                                flight, so that no order is asked for."
                .into(),
        }));
        if self.series.iter().any(|series| series.exact.is_some()) {
            parts.push(Element::Text(
                "Errors are measured against the exact solution, which is the stricter test of a code \
                 [@salari2000, oberkampf2010]: relative to the exact value, those of velocities relative to the impact \
                 velocity. The equation of motion is that of a rigid projectile under the resistance of a crater and a tunnel \
                 [@zaidi2009]."
                    .into(),
            ));
        }
        parts.extend(self.remarks.iter().cloned().map(Element::Text));
        parts
    }

    fn figures(&self) -> Vec<Element> {
        let errors: Vec<Panel> = self.series.iter().map(|series| self.error_panel(series)).collect();
        let values: Vec<Panel> = self.series.iter().filter_map(|series| self.value_panel(series)).collect();
        let drawn = || self.series.iter().filter(|series| series.points.iter().any(|point| point.error.is_some()));
        let measured =
            match (drawn().any(|series| series.is_against_exact), drawn().all(|series| series.is_against_exact)) {
                (_, true) => "Error against the exact value",
                (true, false) => "Error against the exact value, or against the limit where that is another,",
                (false, _) => "Error against the limit of the values",
            };
        let thinned = match self.series.iter().map(Series::thinned).max() {
            Some(each @ 2..) => format!(" One point in {each} is drawn; `report.json` has all."),
            _ => String::new(),
        };
        let figure = |name, message: String, reading: &str, mut panels: Vec<Panel>| {
            panels.retain(|panel| !panel.is_empty());
            let figure = Figure {
                name: name_of(name, ""),
                section: None,
                message,
                reading: format!("{reading}{thinned}"),
                claims: Vec::new(),
                panels,
            };
            (!figure.panels.is_empty()).then_some(Element::Figure(figure))
        };
        let noun = self.size.noun();
        let mut points = self.series.iter().flat_map(|series| &series.points);
        let any_hollow = points.any(|point| !point.used && point.error.is_some());
        let outside = if any_hollow { "; hollow ones are outside the fit" } else { "" };
        [
            figure(
                "error",
                format!("{measured} over the {noun}, quantity by quantity"),
                &format!(
                    "Each point is one solution{outside}. Solid: the law that was fitted. Dashed: slopes to compare with."
                ),
                errors,
            ),
            figure(
                "values",
                format!("Values over the {noun}, each with the error band of the finest"),
                &format!(
                    "Each point is one solution{outside}, less the value in the title of its panel, the finest in the fit; up to ten times \
                     its {noun}. Shaded: that value and its error band. Dashed: the exact value where one is known, else the limit; where it \
                     lies far outside, it is not drawn."
                ),
                values,
            ),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn x_axis(&self) -> Axis {
        Axis::log(self.size.noun(), self.size.unit())
    }

    fn error_panel(&self, series: &Series) -> Panel {
        let y = if series.is_against_exact { "relative error" } else { "relative distance from the limit" };
        let y = Axis::log(y, "");
        let mut panel = Panel::new(series.name.clone(), self.x_axis(), y);
        let of = |used: bool| {
            series.drawn().filter(move |point| point.used == used).filter_map(|point| Some((point.size, point.error?)))
        };
        let used: Vec<_> = of(true).collect();
        if let (Some(order), Some(constant), Some([low, high])) =
            (series.observed_order, series.error_constant, extremes(used.iter().map(|point| point.0)))
        {
            let law = [low, high].map(|size| (size, constant * size.powf(order)));
            panel = panel.series(format!("fit, order {}", order_text(order)), Style::line(1).as_line(), law);
        }
        panel = panel.series("in the fit", Style::marks(0), used.iter().copied());
        let outside: Vec<_> = of(false).collect();
        if !outside.is_empty() {
            panel = panel.series("outside", Style::marks(0).hollow(), outside);
        }
        let coarsest = used.iter().copied().filter(|point| point.1 > 0.0).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((size, error)) = coarsest {
            // Above the points, so that the names of the lines stand free of them.
            let through = (size, SLOPES_ABOVE * error);
            let mut slopes = vec![1.0, 2.0];
            slopes.extend(series.formal_order.filter(|formal| ![1.0, 2.0].contains(formal)));
            if self.size == Size::Tolerance {
                slopes = vec![1.0];
            }
            for slope in slopes {
                panel = panel.slope(format!("order {}", number(slope, 3)), slope, through);
            }
        }
        panel
    }

    fn value_panel(&self, series: &Series) -> Option<Panel> {
        let (size, finest) = series.finest.filter(|(_, value)| value.is_finite())?;
        let band = series.error_band.map_or(0.0, |band| band.half_width);
        let all: Vec<_> = series.drawn().filter(|point| point.value.is_finite()).collect();
        // Beside what the coarsest steps are off by, the error band of the finest could not be seen. It is that of the finest
        // in the fit: finer ones may lie at the floor of round-off.
        let near: Vec<_> = all.iter().copied().filter(|point| point.size <= DECADE * size).collect();
        let points = if near.len() >= FEW { near } else { all };
        let [low, high] = extremes(points.iter().map(|point| point.size))?;
        let offsets = points.iter().map(|point| point.value - finest).chain([-band, band]);
        let reach = offsets.map(f64::abs).fold(0.0, f64::max);
        let (power, unit) = scale_of(reach, series.unit);
        let offset = |value: f64| (value - finest) / power;
        let title = format!("{}, less {}", series.name, series.finest_text());
        let mut panel = Panel::new(title, self.x_axis(), Axis::linear("difference", &unit));
        if band > 0.0 {
            let (top, bottom) = (band / power, -band / power);
            let corners = [(low, bottom), (high, bottom), (high, top), (low, top)];
            panel = panel.series("error band of the finest", Style::area(Ink::Shade), corners);
        }
        let target = series.exact.or(series.limit).filter(|target| (target - finest).abs() <= 3.0 * reach);
        if let Some(target) = target {
            let name = if series.exact.is_some() { "exact" } else { "limit" };
            panel = panel.series(name, Style::REFERENCE, [(low, offset(target)), (high, offset(target))]);
        }
        let of = |used: bool| {
            points.iter().filter(move |point| point.used == used).map(|point| (point.size, offset(point.value)))
        };
        let [used, outside] = [true, false].map(|used| of(used).collect::<Vec<_>>());
        panel = panel.series("in the fit", Style::marks(0), used);
        Some(if outside.is_empty() { panel } else { panel.series("outside", Style::marks(0).hollow(), outside) })
    }

    /// The table of a grid convergence study, in its usual names.
    fn classical(&self) -> Vec<Element> {
        let with: Vec<(&Series, &ThreeGrids)> =
            self.series.iter().filter_map(|series| Some((series, series.three_grids.as_ref()?))).collect();
        if with.is_empty() {
            return Vec::new();
        }
        let header = [Prose::default()].into_iter().chain(with.iter().map(|(series, _)| Prose::text(series.head())));
        let mut sheet = Sheet::grid("grid-convergence", "Grid convergence on three grids".into(), header);
        sheet = sheet.for_papers(1..=with.len());
        let percent = |share: Option<f64>| share.map(|share| 100.0 * share);
        let rows: [(&'static str, Get<'_>); 14] = [
            ("{h_1} [s]", &|_, three| Cell::Number(Some(three.steps[0]), 4)),
            ("{h_2} [s]", &|_, three| Cell::Number(Some(three.steps[1]), 4)),
            ("{h_3} [s]", &|_, three| Cell::Number(Some(three.steps[2]), 4)),
            ("{r_21}", &|_, three| Cell::Number(Some(three.ratios[0]), 4)),
            ("{r_32}", &|_, three| Cell::Number(Some(three.ratios[1]), 4)),
            ("{f_1}", &|series, three| Cell::Number(Some(three.values[0]), series.digits())),
            ("{f_2}", &|series, three| Cell::Number(Some(three.values[1]), series.digits())),
            ("{f_3}", &|series, three| Cell::Number(Some(three.values[2]), series.digits())),
            ("{p}", &|_, three| Cell::Number(three.order, 4)),
            ("{f_ext}", &|series, three| Cell::Number(three.extrapolated, series.digits())),
            ("{e_a} [%]", &|_, three| Cell::Number(percent(three.approximate_error), 3)),
            ("GCI [%]", &|_, three| Cell::Number(percent(three.grid_convergence_index), 3)),
            ("asymptotic ratio", &|_, three| Cell::Number(three.asymptotic_ratio, 4)),
            ("behaviour", &|_, three| Cell::text(three.behaviour.name())),
        ];
        for (name, get) in rows {
            let cells = with.iter().map(|(series, three)| get(series, three));
            sheet = sheet.row([Cell::Prose(name.into())].into_iter().chain(cells));
        }
        vec![
            Element::Table(sheet),
            Element::Text(
                "From fine (1) to coarse (3): {h} the step, {r} the refinement ratio, {f} the value, {p} the observed order \
                 after Celik et al. [@celik2008], with its sign kept, so that a diverging triple is not taken for a converging one; \
                 {f_ext} Richardson's extrapolation, {e_a} = |({f_2} − {f_1})/{f_1}|, GCI = 1.25 {e_a}/({r_21^p} − 1) the grid \
                 convergence index [@roache1994, roache1998]. The asymptotic ratio is near 1 for any three values whose mean is \
                 large beside their differences: it proves nothing, and is not judged."
                    .into(),
            ),
            Element::Text(
                "Three grids see three sizes. Where values jump from step to step, as those at the end of a step do, {p} of three \
                 grids scatters; the order in Table 1 rests on every size."
                    .into(),
            ),
        ]
    }

    /// A paragraph for a paper, the error bars behind it, and what cannot be stated.
    fn uncertainty(&self) -> Vec<Element> {
        let mut parts = Vec::new();
        let stated: Vec<&Series> = self
            .series
            .iter()
            .filter(|series| series.verdict == Verdict::Passed && !series.fixed && series.error_band.is_some())
            .collect();
        if let Some(text) = self.paragraph(&stated) {
            parts.push(Element::Text("To paste into a paper; `uncertainty.tex` has it with its citations:".into()));
            parts.push(Element::Paste(text));
        }
        let bars = self.series.iter().flat_map(|series| series.error_bands.iter().map(move |bar| (series, bar)));
        let bars: Vec<_> = bars.collect();
        if !bars.is_empty() {
            let header = ["quantity", "rule", "±", "factor of safety", "order used"].map(Prose::from);
            let caption = "Error bars of the finest value by published rules".into();
            let sheet = Sheet::cards("error-bars", caption, header).rows(bars, |(series, bar)| {
                [
                    Cell::text(series.head()),
                    Cell::Prose(Prose::text(bar.rule).then(source_of(bar.rule))),
                    Cell::Number(Some(bar.half_width), 3),
                    Cell::Number(Some(bar.safety_factor), 3),
                    Cell::Order(Some(bar.order)),
                ]
            });
            parts.push(Element::Table(sheet));
        }
        let unstated = self.series.iter().filter(|series| series.verdict != Verdict::Passed);
        let unstated: Vec<_> = unstated.map(|series| format!("{} ({})", series.name, series.verdict.name())).collect();
        if !unstated.is_empty() {
            let text = "No uncertainty is stated for {0}; section 1 says why.";
            parts.push(Element::Text(Prose::new(text, &[&unstated.join(", ")])));
        }
        parts
    }

    fn paragraph(&self, stated: &[&Series]) -> Option<Prose> {
        let sizes = extremes(stated.iter().flat_map(|series| &series.points).map(|point| point.size))?;
        let number_of_sizes = stated.iter().map(|series| series.points.len()).max()?;
        let [low, high] = sizes.map(|size| shown(size, 3, self.size.unit()));
        let mut text = Prose::new(
            "The numerical uncertainty was estimated from solutions at {0}{1} between {2} and {3}, as ASME V&V 20 asks \
             [@asme2009].",
            &[
                // Some quantities may have been asked at more of them.
                &if stated.iter().all(|series| series.points.len() == number_of_sizes) { "" } else { "up to " },
                &match self.size {
                    Size::Step => count(number_of_sizes, "time step"),
                    Size::Tolerance => count(number_of_sizes, "relative tolerance"),
                },
                &low,
                &high,
            ],
        );
        // One rule for all is said once.
        let rule = stated.first().and_then(|series| series.error_band).map(|band| band.rule);
        let rule =
            rule.filter(|rule| stated.iter().all(|series| series.error_band.is_some_and(|band| band.rule == *rule)));
        for series in stated {
            let Some((band, (size, _))) = series.error_band.zip(series.finest) else { continue };
            let share = series.relative_band().map_or(String::new(), |share| {
                format!(" ({}\u{a0}% of {})", number(100.0 * share, 2), series.finest_text())
            });
            text = text
                .then(Prose::new(
                    " {u_num}({0}) = {1}{2} at ",
                    &[&series.name, &with_unit(&number(band.half_width, 2), series.unit), &share],
                ))
                .then(self.size.at(size));
            if let (Some(order), Some(interval)) = (series.observed_order, series.interval) {
                let gaps: [&dyn Display; 2] = [&order_text(order), &interval_text(interval)];
                text = text.then(Prose::new(", with an observed order of {0} (95\u{a0}% interval {1})", &gaps));
            }
            text = match rule {
                Some(_) => text.then(".".into()),
                None => text.then(Prose::text(format!("; {}", band.rule))).then(source_of(band.rule)).then(".".into()),
            };
        }
        let rule = rule.map(|rule| {
            Prose::new(" They are half-widths by this rule: {0}", &[&rule]).then(source_of(rule)).then(".".into())
        });
        Some(rule.into_iter().fold(text, Prose::then))
    }

    fn every_size(&self) -> Vec<Element> {
        let rows = self.series.iter().flat_map(|series| series.points.iter().map(move |point| (series, point)));
        let rows: Vec<_> = rows.collect();
        if rows.len() > LISTED_MAX {
            let text = "There are {0}: `report.json` has all of them.";
            return vec![Element::Text(Prose::new(text, &[&count(rows.len(), "row")]))];
        }
        let header =
            ["quantity", "size", "value", "relative error", "against", "in the fit", "why not"].map(Prose::from);
        let header =
            header.into_iter().enumerate().map(|(column, head)| if column == 1 { self.size.symbol() } else { head });
        let caption = "Every size of every quantity".into();
        let sheet = Sheet::grid("sizes", caption, header).rows(rows, |(series, point)| {
            [
                Cell::text(series.head()),
                Cell::Number(Some(point.size), 5),
                Cell::Number(Some(point.value), series.digits().max(6)),
                Cell::Number(point.error, 3),
                Cell::text(match point.error {
                    None => "",
                    Some(_) if series.is_against_exact => "the exact value",
                    Some(_) => "the limit",
                }),
                Cell::text(if point.used { "yes" } else { "no" }),
                Cell::text(point.excluded.map_or("", Exclusion::words)),
            ]
        });
        vec![Element::Folded(sheet)]
    }

    fn cases(&self) -> Vec<Case> {
        let case = |series: &Series| {
            let order = series.observed_order.map_or("none".to_owned(), |order| format!("{order:e}"));
            let band = series.error_band.map_or("none".to_owned(), |band| format!("{:e}", band.half_width));
            let value = series.finest.map_or(f64::NAN, |(_, value)| value);
            let value = with_unit(&format!("{value:e}"), series.unit).replace('\u{a0}', " ");
            let numbers = format!("{} {value}, error band {band}, order {order}", series.name);
            let text = format!("{numbers}\n{}: {}", series.class, series.reason);
            Case { name: series.name.clone(), verdict: series.verdict, numbers, text, wall_ms: 0.0 }
        };
        self.series.iter().map(case).collect()
    }
}

/// The name of a quantity as words: `crater end time`.
pub fn words_of(quantity: Quantity) -> String {
    quantity.name().replace('_', " ")
}

/// The work that a rule comes from.
fn source_of(rule: &str) -> Prose {
    if rule.contains("Celik") {
        " [@celik2008]".into()
    } else if rule.contains("Oberkampf") {
        " [@roache1998, oberkampf2010]".into()
    } else if rule.contains("GCI") {
        " [@roache1998]".into()
    } else if rule.contains("Xing") {
        " [@xing2010]".into()
    } else if rule.contains("Eça") {
        " [@eca2014]".into()
    } else {
        Prose::default()
    }
}

/// What differences up to `reach` are divided by, a power of a thousand, and the unit that they then have.
fn scale_of(reach: f64, unit: &str) -> (f64, String) {
    const PREFIXES: [&str; 6] = ["", "m", "µ", "n", "p", "f"];
    if !(reach > 0.0 && reach.is_finite()) {
        return (1.0, unit.to_owned());
    }
    let thousands = (reach.log10() / 3.0).floor() as i32;
    let power = 1e3_f64.powi(thousands);
    match usize::try_from(-thousands).ok().and_then(|index| PREFIXES.get(index)) {
        Some(prefix) if !unit.is_empty() => (power, format!("{prefix}{unit}")),
        _ if thousands == 0 => (1.0, unit.to_owned()),
        _ => (power, format!("10{} {unit}", exponent(3 * thousands)).trim_end().to_owned()),
    }
}

/// A raised whole number.
fn exponent(of: i32) -> String {
    super::text::power_of_ten(of).chars().skip(2).collect()
}
