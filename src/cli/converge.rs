//! `penetrode converge`: order of convergence of every quantity, fitted and classified.

use std::path::Path;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson, time_option};
use super::output::{Text, interval_text};
use super::report_args::ReportArgs;
use super::verify::progress_bar;
use super::{Answer, Ask, CliError, SceneArgs};
use crate::exchange::input::name_of;
use crate::integrators::central_difference::Steps;
use crate::integrators::{MethodName, MethodOptions};
use crate::physics::{Problem, Shown};
use crate::report::Environment;
use crate::report::environment::hash;
use crate::report::refinement::{PathMet, Refinement, Series, SeriesPoint, Size, relative_to, words_of};
use crate::report::study::Prose;
use crate::studies::asymptotic::TwoPowers;
use crate::studies::audit::ErrorBand;
use crate::studies::convergence::{
    FixedSteps, Ladder, POINTS_DEFAULT, QuantityStudy, TOLERANCES, of_fixed_steps, of_tolerances,
};
use crate::studies::error::Truth;
use crate::studies::grid_convergence::ThreeGrids;
use crate::studies::order::{Class, Exclusion, FittedPoint};
use crate::studies::{Quantity, Verdict};
use crate::text::{count, or_dash};

/// Arguments of `converge`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode converge tunnel --velocity centred --events interpolated --dt 10ns:10us")]
pub struct ConvergeArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Method of integration.
    #[arg(long, value_enum, default_value_t = MethodName::CentralDifference)]
    pub method: MethodName,
    /// central-difference: automatic steps, auto.
    ///
    /// Those of an explicit finite-element code: the sizes are then those of the first step, and their ratio is that of the safety
    /// factors. `solve --steps` says the rule.
    #[arg(long, value_name = "auto", value_parser = ["auto"])]
    pub steps: Option<String>,
    /// central-difference: V in the drag [default: lagged].
    #[arg(long, value_enum)]
    pub velocity: Option<crate::integrators::VelocityAt>,
    /// central-difference: boundaries [default: step-end].
    ///
    /// Where it sees stage ends, exit and rest.
    #[arg(long, value_enum)]
    pub events: Option<crate::integrators::Boundaries>,
    /// Smallest and largest step, such as 10ns:10us.
    ///
    /// By default 1e-5 to 1e-2 of the time to the end. Without it, quantities that these do not decide have other steps, once.
    #[arg(long, value_name = "A:B")]
    pub dt: Option<String>,
    /// How many step sizes or tolerances.
    #[arg(long, default_value_t = POINTS_DEFAULT, value_parser = clap::value_parser!(u16).range(4..=10_000))]
    pub points: u16,
    /// Seed of the random sizes.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Where the report goes.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// What `converge --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ConvergeJson {
    schema: &'static str,
    title: Option<String>,
    method: MethodJson,
    seed: u64,
    /// `closed-form`, or `taylor` where no closed form exists.
    reference: &'static str,
    verdict: Verdict,
    quantities: Vec<QuantityJson>,
    /// What was not studied, and why.
    skipped: Vec<String>,
}

/// The convergence of one quantity.
#[derive(Debug, Serialize, JsonSchema)]
pub struct QuantityJson {
    quantity: Quantity,
    formal_order: Option<f64>,
    observed_order: Option<f64>,
    interval: Option<[f64; 2]>,
    error_constant: Option<f64>,
    /// Exact value, in SI units.
    exact: f64,
    /// Error band of the value at the finest size in the fit; `null` where no law was found.
    error_band: Option<ErrorBand>,
    /// The rule for three grids on the finest, the coarsest and a middle size in the fit; absent for tolerances, `null` where
    /// no law was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub three_grids: Option<Option<ThreeGrids>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    /// Order against the force evaluations; absent for fixed steps, `null` where none was found.
    pub work_order: Option<Option<f64>>,
    /// Leading and next power, fitted together where one alone does not hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    powers: Option<TwoPowers>,
    class: Class,
    verdict: Verdict,
    /// Why this verdict; for a plain pass, why this class.
    reason: String,
    /// Runs that failed, had another outcome than the exact one, or were not begun because the work allowed was spent.
    lost_runs: usize,
    points: Vec<PointJson>,
}

/// One run.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PointJson {
    #[serde(skip_serializing_if = "Option::is_none")]
    dt_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rtol: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_evaluations: Option<u64>,
    /// Value, in SI units.
    value: f64,
    error: f64,
    used: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    excluded: Option<Exclusion>,
}

impl Ask for ConvergeArgs {
    type Answer = ConvergeJson;

    fn ask(&self) -> Result<Answer<ConvergeJson>, CliError> {
        self.report.check("converge", &[Path::new(&self.scene.path)])?;
        let (scene, problem) = self.scene.settings.read_problem(&self.scene.path)?;
        let (rtol, dt, steps) = (None, None, self.steps.clone());
        let method = MethodArgs { method: self.method, rtol, dt, steps, velocity: self.velocity, events: self.events };
        if self.method == MethodName::ClosedForm {
            return Err(CliError::usage("the closed form has no order of convergence", "choose an integrator"));
        }
        method.build()?;
        let fixed = self.method == MethodName::CentralDifference;
        if self.dt.is_some() && !fixed {
            return Err(CliError::usage("only central-difference has a fixed step", "leave out --dt"));
        }
        let truth = Truth::of(&problem)?;
        if truth.flight.end.time <= 0.0 {
            return Err(CliError::usage(
                "the flight takes no time, and has no order of convergence",
                "give it a velocity and a target",
            )
            .in_file(&self.scene.path));
        }
        let range = self.steps()?;
        let points = usize::from(self.points);
        let options = method.options()?;
        let study = if fixed {
            // The first step at the safety factor one, to which all automatic steps are in proportion.
            let whole = MethodOptions { steps: Some(Steps::Automatic(1.0)), ..options.clone() }.central_difference();
            let whole = whole.time_step(&problem);
            let with_step = |size| {
                let steps = options.steps.as_ref().map(|_| Steps::Automatic(size / whole));
                MethodOptions { dt: Some(size), steps, ..options.clone() }.central_difference()
            };
            let bar = progress_bar(0, "runs");
            let progress = |done, planned| {
                bar.set_length(planned);
                bar.set_position(done);
            };
            let study = FixedSteps {
                scheme: &with_step,
                range,
                points,
                seed: self.seed,
                with_critical: true,
                progress: &progress,
            };
            let study = of_fixed_steps(&scene, &problem, &truth.flight, &study);
            bar.finish_and_clear();
            study?
        } else {
            let [from, to] = TOLERANCES;
            of_tolerances(&problem, &truth.flight, self.method, Ladder { from, to, points, seed: self.seed })?
        };
        // Failed if a quantity diverges or misses its formal order, else undecided if one is.
        let verdicts = study.quantities.iter().map(|study| study.verdict);
        let verdict = verdicts.max().unwrap_or(Verdict::Undecided);
        let without = |why: String| format!("{} is not studied: {why}", Quantity::CriticalVelocity);
        let data = ConvergeJson {
            schema: "penetrode/converge/1",
            title: scene.title.clone(),
            method: MethodJson::new(self.method, &options, None, None),
            seed: self.seed,
            reference: if truth.is_exact { "closed-form" } else { "taylor" },
            verdict,
            quantities: study.quantities.into_iter().map(|study| QuantityJson::new(study, fixed)).collect(),
            skipped: study.no_critical_velocity.map(without).into_iter().collect(),
        };
        let mut text = data.text(problem.impact_speed);
        text += &self.report.write(&data, |e| {
            let path = PathMet::of(&problem, &scene, &truth.flight);
            data.refinement(&self.scene.path, &problem, path, e).report()
        })?;
        Ok(Answer { text, exit: verdict.into(), data: Some(data) })
    }
}

impl ConvergeArgs {
    /// Smallest and largest step (s), if given.
    fn steps(&self) -> Result<Option<[f64; 2]>, CliError> {
        let Some(text) = &self.dt else { return Ok(None) };
        let help = "write the smallest and the largest step, such as 10ns:10us";
        let refuse = |what| CliError::usage(format!("--dt {text}{what}"), help);
        let (a, b) = text.split_once(':').ok_or_else(|| refuse(" is not a range"))?;
        let (a, b) = (time_option(a, help)?, time_option(b, help)?);
        if a > 0.0 && a < b && b.is_finite() {
            Ok(Some([a, b]))
        } else {
            Err(refuse(": the first must be above zero and below the second"))
        }
    }
}

impl QuantityJson {
    fn series(&self) -> Series {
        let point = |point: &PointJson| SeriesPoint {
            size: point.dt_s.or(point.rtol).unwrap_or(f64::NAN),
            value: point.value,
            error: Some(point.error),
            used: point.used,
            excluded: point.excluded,
        };
        let points: Vec<SeriesPoint> = self.points.iter().map(point).collect();
        let finest = points.iter().find(|point| point.used).or(points.first());
        Series {
            name: words_of(self.quantity),
            unit: self.quantity.unit(),
            verdict: self.verdict,
            class: self.class.name(),
            reason: self.reason.clone(),
            proved: None,
            advice: None,
            formal_order: self.formal_order,
            observed_order: self.observed_order,
            interval: self.interval,
            error_constant: self.error_constant,
            fixed: false,
            limit: None,
            exact: Some(self.exact),
            agrees: self.class == Class::Converging,
            relative_error: finest.and_then(|point| point.error),
            relative_to: relative_to(self.quantity),
            is_against_exact: true,
            finest: finest.map(|point| (point.size, point.value)),
            error_band: self.error_band,
            error_bands: Vec::new(),
            three_grids: self.three_grids.flatten(),
            points,
        }
    }

    fn new(study: QuantityStudy, fixed: bool) -> Self {
        let (against, error_band) = (study.against, study.error_band());
        let three_grids = fixed.then(|| study.three_grids());
        let work = study.work.and_then(Result::ok).and_then(|fit| fit.line);
        let (line, class, fitted, points) = match study.fit {
            Ok(fit) => (fit.line, fit.class, fit.reason, fit.points),
            Err(error) => (None, Class::Undecided, error.to_string(), Vec::new()),
        };
        // A plain pass has no other reason than its fit.
        let reason = if study.reason.is_empty() { fitted } else { study.reason };
        let point = |(index, point): (usize, FittedPoint)| PointJson {
            dt_s: fixed.then_some(point.step),
            rtol: (!fixed).then_some(point.step),
            force_evaluations: study.evaluations.get(index).copied(),
            value: against.value(point.error),
            error: point.error.abs(),
            used: point.used,
            excluded: point.excluded,
        };
        Self {
            quantity: study.quantity,
            formal_order: study.formal,
            observed_order: line.map(|line| line.order),
            interval: line.map(|line| line.interval95),
            error_constant: line.map(|line| line.error_constant),
            exact: against.exact,
            error_band,
            three_grids,
            work_order: (!fixed).then(|| work.map(|line| line.order)),
            powers: study.powers,
            class,
            verdict: study.verdict,
            reason,
            lost_runs: study.lost,
            points: points.into_iter().enumerate().map(point).collect(),
        }
    }
}

impl ConvergeJson {
    /// The study of the scheme on the scene at `path`, for its report.
    fn refinement(&self, path: &str, problem: &Problem, met: PathMet, environment: Environment) -> Refinement {
        let file = name_of(Path::new(path));
        let size = if self.method.name == MethodName::CentralDifference.name() { Size::Step } else { Size::Tolerance };
        let reference = match self.reference {
            "closed-form" => "the closed form",
            _ => "the Taylor series to round-off, for there is no closed form",
        };
        let scene = self.title.as_deref().unwrap_or(&file);
        let subject = Prose::new(
            "Code verification of `{0}`{1} on the scene `{2}`: {3} at {4} against {5}.",
            &[
                &self.method.name,
                &self.method.rules(),
                &file,
                &if self.quantities.len() == 1 {
                    "1 quantity".to_owned()
                } else {
                    format!("{} quantities", self.quantities.len())
                },
                &match (size, self.quantities.iter().map(|q| q.points.len()).max().unwrap_or(0)) {
                    (Size::Step, sizes) => count(sizes, "step size"),
                    (Size::Tolerance, 1) => "1 tolerance".to_owned(),
                    (Size::Tolerance, sizes) => format!("{sizes} tolerances"),
                },
                &reference,
            ],
        );
        Refinement {
            title: format!("{}: {scene}", self.method.name),
            subject,
            size,
            verdict: self.verdict,
            series: self.quantities.iter().map(QuantityJson::series).collect(),
            method: format!("{}{}", self.method.name, self.method.rules()),
            path: Some(met),
            judged: vec![
                ("Scheme", format!("{}{}", self.method.name, self.method.rules())),
                ("Scene", format!("{scene} ({file}), impact velocity {} m/s", Shown(problem.impact_speed))),
                ("Exact values", reference.to_owned()),
                ("Sizes", format!("log-uniform with random ratios, seed {}", self.seed)),
            ],
            remarks: self.skipped.iter().map(|note| Prose::text(format!("{note}."))).collect(),
            environment,
            inputs: vec![
                ("Seed", self.seed.to_string()),
                ("Problem (BLAKE3 of its stages in SI units)", hash(format!("{problem:?}"))),
            ],
        }
    }

    fn text(&self, impact_speed: f64) -> String {
        let mut text = Text::titled(self.title.as_deref());
        text.line(format!("  method     {}{}", self.method.name, self.method.rules()));
        text.line(format!("  reference  {}, V0 = {} m/s", self.reference, Shown(impact_speed)));
        text.gap();
        let row = |q: &QuantityJson| {
            let order = |value| or_dash(value, |order| format!("{order:.2}"));
            let used = q.points.iter().filter(|p| p.used).count();
            [
                q.quantity.to_string(),
                order(q.formal_order),
                order(q.observed_order),
                interval_text(q.interval),
                or_dash(q.error_constant, |constant| format!("{constant:.1e}")),
                format!("{used}/{}", q.points.len() + q.lost_runs),
                q.class.name().to_owned(),
            ]
        };
        let header = ["quantity", "formal", "found", "95 % interval", "constant", "used", "class"];
        text.table(&header, self.quantities.iter().map(row));
        // A pass by two powers says so; one by a single power is in the table.
        for q in self.quantities.iter().filter(|q| q.verdict != Verdict::Passed || q.powers.is_some()) {
            text.wrapped("  ", &format!("{}: {} ({})", q.quantity, q.verdict.name(), q.reason));
        }
        self.skipped.iter().for_each(|note| text.wrapped("  ", note));
        text.line(format!("  verdict    {}", self.verdict.name()));
        text.finish()
    }
}
