//! `penetrode experiments`: measured depths, residual velocities, ballistic limits and outcomes beside predicted ones, shipped or a
//! user's own.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, check_table, write_table};
use super::{Answer, Ask, CliError, Exit};
use crate::exchange::input::name_of;
use crate::exchange::tables::read_bytes;
use crate::report::{cells, sweep_figures};
use crate::studies::experiments::ballistic_limit::{OutcomeFit, ResidualFit};
use crate::studies::experiments::perforation::{Group, Perforations};
use crate::studies::experiments::resistance::{self, ResistanceFit};
use crate::studies::experiments::strength::{self, StrengthSummary};
use crate::studies::experiments::{self, Comparison, EXPERIMENTS, SetSummary, Shots, shot};
use crate::studies::sensitivity;
use crate::text::{count, one_line, or_dash};

/// Arguments of `experiments`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/experiments.txt"))]
pub struct ExperimentsArgs {
    /// Tables of measured tests; those that ship when left out.
    pub tables: Vec<PathBuf>,
    /// Crater depth in diameters [default: 0.707 + h/d].
    #[arg(long, allow_hyphen_values = true)]
    pub k: Option<f64>,
    /// Uncertainty for target.strength=5%; repeatable.
    ///
    /// Each gives the relative standard deviation of a number of the tests.
    #[arg(long, value_name = "PATH=REL")]
    pub spread: Vec<String>,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write this CSV file and a figure beside it.
    ///
    /// - is standard output, without a figure.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
}

/// What `experiments --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExperimentsJson {
    /// `penetrode/experiments/1`.
    pub schema: &'static str,
    /// Method of solution.
    pub method: MethodJson,
    /// Sets; experiments with X/d below 0.5 stand apart.
    pub sets: Vec<SetSummary>,
    /// Experiments in the order of the tables.
    #[serde(rename = "shots")]
    pub comparisons: Vec<Comparison>,
    /// Sets by strength.
    pub strengths: Vec<StrengthSummary>,
    /// S of each set of three depths and more.
    pub resistance: Vec<ResistanceFit>,
    /// Residual velocities, ballistic limits and outcomes.
    pub perforation: Perforations,
    /// Rows that their table excludes.
    pub excluded: Vec<LeftOut>,
    /// Rows that cannot be used.
    pub refused: Vec<String>,
    /// Depths of shots that perforated, which do not count.
    pub depths_of_perforations: usize,
    /// Columns that are not read.
    pub columns_not_read: Vec<String>,
    /// What the shipped data validate, and what not; `null` for a user's own.
    pub meaning: Option<&'static str>,
}

/// A row that does not count.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LeftOut {
    /// Set.
    pub set: String,
    /// Line in its file, from 1.
    pub line: u64,
    /// What its table gives as the reason.
    pub reason: String,
}

/// What stands behind the name of the table in the names of the figures beside it.
const FIGURES: [&str; 2] = ["", "-residual"];

impl Ask for ExperimentsArgs {
    type Answer = ExperimentsJson;

    fn table(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn ask(&self) -> Result<Answer<ExperimentsJson>, CliError> {
        let spreads = sensitivity::spreads(&self.spread)?;
        let inputs: Vec<_> = self.tables.iter().map(|path| ("the measured table", path.as_path())).collect();
        check_table(&inputs, self.table(), &FIGURES)?;
        let table = self.shots()?;
        let method = self.method.build()?;
        let depths = experiments::depths(&table.shots);
        let comparisons = experiments::compare(&depths, self.k, &spreads, method.integrator())?;
        let perforation = Perforations::of(&table.shots, self.k, &spreads, method.integrator())?;
        if let Some(path) = &self.out {
            let figures = [
                (!comparisons.is_empty()).then(|| sweep_figures::measured_depths(&comparisons, &[])),
                sweep_figures::residual_velocities(&perforation).map(Some),
            ];
            let (endings, figures): (Vec<_>, Vec<_>) =
                FIGURES.into_iter().zip(figures).filter_map(|(ending, figure)| Some((ending, figure?))).unzip();
            let csv = sweep_figures::measured_table(&table, &comparisons, &perforation);
            write_table(path, Ok(csv.into_bytes()), &endings, figures)?;
        }
        let excluded = table.shots.iter().filter_map(|shot| {
            Some(LeftOut { set: shot.set.clone(), line: shot.line, reason: shot.excluded.clone()? })
        });
        let data = ExperimentsJson {
            schema: "penetrode/experiments/1",
            method: MethodJson::new(self.method.method, &self.method.options()?, None, None),
            sets: experiments::summaries(&comparisons),
            strengths: strength::by_strength(&comparisons),
            resistance: resistance::fits(&comparisons),
            comparisons,
            perforation,
            excluded: excluded.collect(),
            refused: table.refused.iter().map(ToString::to_string).collect(),
            depths_of_perforations: table.shots.iter().filter(|shot| shot.has_depth_of_perforation).count(),
            columns_not_read: table.others,
            meaning: self.tables.is_empty().then_some(experiments::MEANING),
        };
        let exit = if data.refused.is_empty() { Exit::Success } else { Exit::Criterion };
        Ok(Answer { text: data.text(), data: Some(data), exit })
    }
}

impl ExperimentsArgs {
    fn shots(&self) -> Result<Shots, CliError> {
        if self.tables.is_empty() {
            return Ok(Shots { shots: experiments::shipped_shots()?, ..Shots::default() });
        }
        let mut all = Shots::default();
        for path in &self.tables {
            let set = path.file_stem().map_or_else(|| "own".to_owned(), |stem| stem.to_string_lossy().into_owned());
            all.append(shot::read(&name_of(path), &read_bytes(path, &EXPERIMENTS)?, &set)?);
        }
        Ok(all)
    }
}

/// `410.2 (398.1 to 422.3)`.
fn with_interval(value: f64, [low, high]: [f64; 2], digits: usize) -> String {
    format!("{value:.digits$} ({low:.digits$} to {high:.digits$})")
}

impl ExperimentsJson {
    fn text(&self) -> String {
        let mut text = Text::default();
        if !self.sets.is_empty() {
            self.add_depths(&mut text);
        }
        self.add_perforation(&mut text);
        self.add_rows(&mut text);
        if let Some(meaning) = self.meaning {
            text.gap();
            text.wrapped("  ", meaning);
        }
        text.finish()
    }

    fn add_depths(&self, text: &mut Text) {
        text.part(format!("Predicted over measured depth, method {}", self.method.name));
        text.gap();
        let rows = || cells::sets(&self.sets);
        let header = ["set", "tests", "median", "spread", "range", "±20 %", "outliers"];
        text.table(&header, rows().map(|row| row.into_iter().take(7).collect::<Vec<_>>()));
        text.gap();
        let [set, .., in_range, error, interval, uncertainty, within] = cells::SETS;
        let errors = rows().map(|[set, .., in_range, error, interval, _, _]| [set, in_range, error, interval]);
        text.table(&[set, in_range, error, interval], errors);
        text.gap();
        if self.sets.iter().any(|set| set.with_validation_uncertainty > 0) {
            text.table(&[set, uncertainty, within], rows().map(|[set, .., bound, within]| [set, bound, within]));
            text.gap();
        }
        text.line("  after ASME V&V 20: E = S - D, u_val² = u_num² + u_input² + u_D²");
        text.lines(cells::uncertainties(&self.comparisons).map(|(name, known)| format!("  {name:<18} {known}")));
        let outliers = self
            .comparisons
            .iter()
            .filter(|comparison| comparison.is_outlier)
            .map(|c| format!("{} line {} ({:.2})", one_line(&c.experiment.set), c.experiment.line, c.ratio));
        let outliers: Vec<String> = outliers.collect();
        if !outliers.is_empty() {
            text.wrapped("  outliers           ", &outliers.join(", "));
        }
        text.part("By strength: predicted over measured depth");
        text.gap();
        let header = ["set", "fc [MPa]", "tests", "mean", "95 % of it", "in range"];
        text.table(
            &header,
            self.strengths.iter().map(|found| {
                let [low, high] = found.strength_pa.map(|strength| format!("{:.1}", 1e-6 * strength));
                [
                    one_line(&found.set),
                    if low == high { low } else { format!("{low} to {high}") },
                    found.ratio.count.to_string(),
                    format!("{:.2}", found.ratio.mean),
                    found.ratio.mean95.map_or("-".to_owned(), |[low, high]| format!("{low:.2} to {high:.2}")),
                    found.in_range_of_fit.to_string(),
                ]
            }),
        );
        if self.resistance.is_empty() {
            return;
        }
        text.part("Fit of S = c (fc/MPa)^-1/2, c = 72 in Eq. 14, to depths from X/d = 0.5");
        text.gap();
        let header = ["set", "tests", "c (95 %)", "S", "R [MPa]", "fitted", "left out"];
        text.table(
            &header,
            self.resistance.iter().map(|fit| {
                [
                    one_line(&fit.set),
                    fit.tests.to_string(),
                    with_interval(fit.coefficient.value, fit.coefficient.interval95, 1),
                    or_dash(fit.static_factor.map(|factor| factor.value), |factor| format!("{factor:.2}")),
                    or_dash(fit.strength_pa.map(|strength| 1e-6 * strength.value), |strength| format!("{strength:.0}")),
                    or_dash(fit.fitted.deviation, |deviation| format!("{deviation:.2}")),
                    or_dash(fit.left_out.deviation, |deviation| format!("{deviation:.2}")),
                ]
            }),
        );
        let note = "fitted: sample deviation of predicted over measured depth with this c; left out: each depth with the c of the others";
        text.wrapped("  ", note);
    }

    fn add_perforation(&self, text: &mut Text) {
        if self.perforation.is_empty() {
            return;
        }
        text.part(format!("Perforated or stopped, method {}", self.method.name));
        text.gap();
        let header = ["set", "tests", "as predicted", "model only", "test only", "undecided"];
        text.table(
            &header,
            self.perforation.sets.iter().map(|set| {
                let counts = [set.shots, set.right, set.model_only, set.test_only, set.undecided];
                [one_line(&set.set)].into_iter().chain(counts.map(|count| count.to_string())).collect::<Vec<_>>()
            }),
        );
        let residuals: Vec<_> =
            self.perforation.sets.iter().filter_map(|set| Some((set, set.residual_error_m_s?))).collect();
        if !residuals.is_empty() {
            text.part("Residual velocity: E = predicted less measured [m/s]");
            text.gap();
            let header = ["set", "tests", "mean E", "95 % of it", "deviation", "|E| <= u_val"];
            text.table(
                &header,
                residuals.iter().map(|(set, error)| {
                    [
                        one_line(&set.set),
                        error.count.to_string(),
                        format!("{:+.1}", error.mean),
                        error.mean95.map_or("-".to_owned(), |[low, high]| format!("{low:+.1} to {high:+.1}")),
                        or_dash(error.deviation, |deviation| format!("{deviation:.1}")),
                        match set.with_validation_uncertainty {
                            0 => "not given".to_owned(),
                            given => format!("{} of {given}", set.within_validation_uncertainty),
                        },
                    ]
                }),
            );
        }
        if !self.perforation.limits.is_empty() {
            text.part("Ballistic limits [m/s]");
            text.gap();
            let header = ["set", "line", "H [mm]", "measured", "V_c", "V_c over it", "in interval"];
            text.table(
                &header,
                self.perforation.limits.iter().map(|limit| {
                    let measured = limit.measured_limit_m_s;
                    [
                        one_line(&limit.set),
                        limit.line.to_string(),
                        format!("{:.1}", 1e3 * limit.thickness_m),
                        limit.interval_m_s.map_or(format!("{measured:.1}"), |ends| with_interval(measured, ends, 1)),
                        format!("{:.1}", limit.predicted_limit_m_s),
                        format!("{:.2}", limit.ratio),
                        match limit.within_interval {
                            Some(true) => "yes".to_owned(),
                            Some(false) => "no".to_owned(),
                            None => "-".to_owned(),
                        },
                    ]
                }),
            );
        }
        if !self.perforation.groups.is_empty() {
            text.part("Ballistic limits of groups of shots, with 95 % intervals");
        }
        for group in &self.perforation.groups {
            text.gap();
            add_group(text, group);
        }
    }

    fn add_rows(&self, text: &mut Text) {
        let notes: [(usize, String); 2] = [
            (
                self.excluded.len(),
                format!(
                    "{} excluded by the table: {}",
                    count(self.excluded.len(), "row"),
                    self.excluded
                        .iter()
                        .map(|row| format!("{} line {} ({})", one_line(&row.set), row.line, one_line(&row.reason)))
                        .collect::<Vec<_>>()
                        .join(", ")
                ),
            ),
            (
                self.depths_of_perforations,
                format!(
                    "{} of shots that perforated left out: the projectile was not stopped there",
                    count(self.depths_of_perforations, "depth")
                ),
            ),
        ];
        let mut notes: Vec<String> =
            notes.into_iter().filter(|(number, _)| *number > 0).map(|(_, note)| note).collect();
        if !self.columns_not_read.is_empty() {
            let names: Vec<String> = self.columns_not_read.iter().map(|name| one_line(name)).collect();
            notes.push(format!("columns that are not read: {}", names.join(", ")));
        }
        if !self.refused.is_empty() {
            notes.push(format!("{} cannot be used:", count(self.refused.len(), "row")));
        }
        notes.extend(self.refused.iter().map(|message| format!("  {}", one_line(message))));
        if !notes.is_empty() {
            text.gap();
        }
        for note in &notes {
            text.wrapped("  ", note);
        }
    }
}

fn add_group(text: &mut Text, group: &Group) {
    let range = |[low, high]: [f64; 2], factor: f64| {
        let [low, high] = [low, high].map(|value| format!("{:.4}", factor * value));
        let [low, high] = [&low, &high].map(|text| text.trim_end_matches('0').trim_end_matches('.').to_owned());
        if low == high { low } else { format!("{low} to {high}") }
    };
    text.wrapped(
        "  ",
        &format!(
            "{}: {}, d {} mm, H {} mm, M {} kg, fc {} MPa",
            one_line(&group.set),
            count(group.shots, "shot"),
            range([group.diameter_m; 2], 1e3),
            range([group.thickness_m; 2], 1e3),
            range(group.mass_kg, 1.0),
            range(group.strength_pa, 1e-6),
        ),
    );
    text.line(format!("    model          V_c {:.1} m/s", group.predicted_limit_m_s));
    for (name, fit) in [("Recht-Ipson", &group.recht_ipson), ("Lambert-Jonas", &group.lambert_jonas)] {
        let Some(ResidualFit { shots, a, p, p95, limit_m_s, .. }) = fit else { continue };
        let power = p95.map_or_else(|| format!("{p:.0}"), |ends| with_interval(*p, ends, 2));
        text.wrapped(
            &format!("    {name:<15}"),
            &format!(
                "p {power}, a {}, V_bl {} m/s, of {}",
                with_interval(a.value, a.interval95, 3),
                with_interval(limit_m_s.value, limit_m_s.interval95, 1),
                count(*shots, "residual velocity").replace("velocitys", "velocities"),
            ),
        );
    }
    let Some(OutcomeFit { perforated, stopped, v50_m_s, v50_95_m_s: [low, high], deviation_m_s, .. }) = group.outcomes
    else {
        return;
    };
    let end = |end: Option<f64>| end.map_or("no bound".to_owned(), |end| format!("{end:.1}"));
    let how = match deviation_m_s {
        Some(deviation) => format!("probit, deviation {deviation:.1} m/s"),
        None => "fastest stop and slowest perforation, no mixed results".to_owned(),
    };
    text.wrapped(
        "    V50            ",
        &format!("{v50_m_s:.1} ({} to {}) m/s: {how}; {perforated} perforated, {stopped} stopped", end(low), end(high)),
    );
}
