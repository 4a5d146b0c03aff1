//! `penetrode critical`: V_c and E_c by argmin, closed form and Eq. 15 beside them.

use std::collections::BTreeMap;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, engineering, error_text, say, significant};
use super::scene_json::SceneJson;
use super::solve::boxed_sides;
use super::{Answer, Ask, CliError, Exit, SceneArgs};
use crate::exchange::scene_file::SceneFile;
use crate::integrators::{Detail, Integrator, MethodName, Taylor};
use crate::physics::semi_empirical::{eq15_printed, eq15_printed_validity, eq15_unrounded, perforation_validity};
use crate::physics::{Criterion, Scene, Shown, groups};
use crate::studies::boxes::Region;
use crate::studies::critical_velocity::CriticalVelocity;
use crate::studies::sensitivity::{self, Design, Share, Spread, Uncertainty};
use crate::studies::{applicability, critical_velocity, enclosure};
use crate::text::digits_between;

/// Random scenes of `--spread` where nothing else is asked for, and with the criterion `plug`.
const SAMPLES: u32 = 100_000;
const SAMPLES_OF_PLUG: u32 = 2_000;

/// What is said where no velocity is critical.
const SEVERAL: &str = "paths cross here: no velocity is critical, and the intervals were found by a scan";

/// Arguments of `critical`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode critical paper-slab --spread target.strength=5%")]
pub struct CriticalArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// enclosure: V_c for target.strength=34MPa:38MPa; repeatable.
    ///
    /// The number lies anywhere between the two values. Nothing perforates below the least V_c of the box.
    #[arg(long = "box", value_name = "PATH=A:B", conflicts_with = "spread")]
    pub sides: Vec<String>,
    /// Uncertainty for target.strength=5%; repeatable.
    ///
    /// Each gives the relative standard deviation of a number of the scene, which is lognormal unless :normal or :uniform follows, as in
    /// projectile.mass=1%:normal. eq14 is the scatter of Eq. 14 itself, on S, by the measured depths that ship.
    #[arg(long, value_name = "PATH=REL")]
    pub spread: Vec<String>,
    /// Random scenes behind it [default: 100000].
    ///
    /// With the criterion plug 2,000 by default: each V_c takes some fifty flights there.
    #[arg(long, requires = "spread", value_parser = clap::value_parser!(u32).range(2..=100_000_000))]
    pub samples: Option<u32>,
    /// Seed of the random scenes.
    #[arg(long, default_value_t = 1, requires = "spread")]
    pub seed: u64,
    /// Probability of the design value.
    ///
    /// Share of the random scenes whose V_c may lie below it.
    #[arg(long, value_name = "P", default_value = "5%", requires = "spread", value_parser = probability)]
    pub design: f64,
}

/// A probability between zero and one, or percent.
fn probability(text: &str) -> Result<f64, String> {
    let (digits, unit) = text.trim().strip_suffix('%').map_or((text, 1.0), |digits| (digits, 0.01));
    match digits.trim().parse::<f64>().map(|number| number * unit) {
        Ok(number) if number > 0.0 && number < 1.0 => Ok(number),
        _ => Err("write a probability between 0 and 1, or percent: 5%".to_owned()),
    }
}

/// What `critical --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CriticalJson {
    schema: &'static str,
    scene: SceneJson,
    method: MethodJson,
    /// Intervals of impact velocities that perforate; `null` for no upper end.
    perforating_velocities_m_s: Vec<(f64, Option<f64>)>,
    /// `null` where more than one interval perforates.
    critical_velocity_m_s: Option<f64>,
    error_bar_m_s: Option<f64>,
    critical_energy_j: Option<f64>,
    dimensionless_energy: Option<f64>,
    evaluations: Option<u32>,
    note: &'static str,
    closed_form: Option<ClosedCriticalJson>,
    relative_error: Option<f64>,
    eq15: Option<Eq15Json>,
    /// With `--method enclosure`: between which numbers V_c lies, of the numbers as written.
    #[serde(skip_serializing_if = "Option::is_none")]
    enclosure: Option<EnclosureJson>,
    /// With `--box`: the numbers that vary, and from which value to which; the enclosure is that of all of it.
    #[serde(rename = "box", skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(default)]
    sides: BTreeMap<String, (f64, f64)>,
    /// V_c of the same slab by other criteria, with the criterion `plug`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    criteria: Vec<CriterionJson>,
    /// V_r just above V_c, with the criterion `plug`: it jumps there from nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default)]
    residual_velocity_at_limit_m_s: Option<f64>,
    /// Uncertainty of V_c from the spreads asked for; `null` without any.
    uncertainty: Option<Uncertainty>,
    /// What was asked for and not computed, and why.
    skipped: Vec<String>,
}

/// What is proved of V_c.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EnclosureJson {
    /// Least and greatest (m/s): at the one the projectile stops, at the other it perforates. `null` without a proof.
    critical_velocity_m_s: Option<(f64, f64)>,
}

/// V_c by another criterion; `null` where there is none.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CriterionJson {
    criterion: &'static str,
    critical_velocity_m_s: Option<f64>,
}

/// The exact critical velocity.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ClosedCriticalJson {
    critical_velocity_m_s: f64,
    critical_energy_j: f64,
    dimensionless_energy: Option<f64>,
}

/// Eq. 15 as E_c/(d³ fc), beside the simulation.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Eq15Json {
    /// With the printed coefficients.
    pub printed: f64,
    /// With unrounded coefficients.
    pub unrounded: f64,
    /// Whether H/d lies in the range of the formula.
    pub valid: bool,
    /// What is to be known of that range.
    pub note: String,
}

impl Eq15Json {
    /// Eq. 15 for `scene`; `None` for stages, layers and semi-infinite targets.
    pub fn new(scene: &Scene) -> Option<Self> {
        let concrete = scene.concrete().filter(|c| c.layers.is_empty())?;
        let ratio = scene.thickness? / concrete.diameter;
        let (printed, unrounded) = (eq15_printed(ratio), eq15_unrounded(ratio));
        let range = eq15_printed_validity(ratio);
        let relation = perforation_validity(ratio);
        Some(Self {
            printed: concrete.static_factor * printed,
            unrounded: concrete.static_factor * unrounded,
            valid: range.valid && relation.valid,
            note: if range.valid { relation.note } else { range.note },
        })
    }
}

impl Ask for CriticalArgs {
    type Answer = CriticalJson;

    fn ask(&self) -> Result<Answer<CriticalJson>, CliError> {
        let SceneFile { scene, written } = self.scene.settings.read_file(&self.scene.path)?;
        if scene.thickness.is_none() {
            return Err(CliError::usage(
                "a semi-infinite target has no critical velocity",
                "give the target a thickness: [target] thickness = \"180 mm\"",
            )
            .in_file(&self.scene.path));
        }
        let method = self.method.build()?;
        let spreads = sensitivity::spreads(&self.spread)?;
        let encloses = self.method.method == MethodName::Enclosure;
        // The proof needs a guess, and takes the fastest method for it.
        let taylor = Taylor::default();
        let integrator = if encloses { &taylor } else { method.integrator() };
        if encloses {
            // What no flight is enclosed of has no V_c that is.
            enclosure::refusal(&scene, &written)?;
        }
        let (intervals, mut found) = critical_velocity::speeds(&scene, integrator)?;
        let sides = boxed_sides(&self.sides, encloses)?;
        let proved = match (&found, sides.as_slice()) {
            _ if !encloses => None,
            (Some(found), []) => enclosure::between(&scene, &written, found.velocity),
            (_, []) => None,
            (_, sides) => Region::new(&scene, &written, sides)?.critical(),
        };
        let enclosure = encloses.then_some(EnclosureJson { critical_velocity_m_s: proved });
        if sides.is_empty()
            && let (Some(found), Some(EnclosureJson { critical_velocity_m_s: Some((low, high)) })) =
                (&mut found, &enclosure)
        {
            found.velocity = low + 0.5 * (high - low);
            found.error_bar = Some(0.5 * (high - low));
            found.energy = 0.5 * scene.mass * found.velocity * found.velocity;
        }
        let shown = found.as_ref().map_or(intervals[0].low.velocity, |found| found.velocity);
        let exact = critical_velocity::exact(&scene).ok();
        let problem = scene.resolve(shown)?;
        let warnings = applicability::warnings(&scene, shown).into_iter();
        let warnings = warnings.chain(applicability::drag_in_crater(&scene, &problem));
        for warning in scene.exit_depth_warning().into_iter().chain(warnings) {
            say("warning: ", &warning);
        }
        let is_zero = exact == Some(0.0) || (found.is_some() && shown == 0.0);
        let uncertainty = match spreads.as_slice() {
            [_, ..] if !is_zero && found.is_some() => {
                let samples = self.samples.unwrap_or(if scene.plug.is_some() { SAMPLES_OF_PLUG } else { SAMPLES });
                Some(sensitivity::uncertainty(&scene, &spreads, samples as usize, self.seed, self.design)?)
            }
            _ => None,
        };
        let why_none = if is_zero {
            Some("V_c is 0, and no spread is relative to it")
        } else {
            found.is_none().then_some("several ranges of velocities perforate, and no velocity is critical")
        };
        let no_spread =
            why_none.filter(|_| !spreads.is_empty()).map(|why| format!("the uncertainty does not apply: {why}"));
        let concrete = scene.concrete().filter(|concrete| concrete.layers.is_empty());
        let dimensionless = |energy: f64| concrete.map(|concrete| groups::dimensionless_energy(energy, concrete));
        let data = CriticalJson {
            schema: "penetrode/critical/1",
            scene: SceneJson::new(&scene, &problem),
            method: MethodJson::new(self.method.method, &self.method.options()?, Some(&problem), None),
            perforating_velocities_m_s: intervals
                .iter()
                .map(|interval| (interval.low.velocity, interval.high.map(|high| high.velocity)))
                .collect(),
            critical_velocity_m_s: found.as_ref().map(|found| found.velocity),
            error_bar_m_s: found.as_ref().and_then(|found| found.error_bar),
            critical_energy_j: found.as_ref().map(|found| found.energy),
            dimensionless_energy: found.as_ref().and_then(|found| dimensionless(found.energy)),
            evaluations: found.as_ref().map(|found| found.evaluations),
            note: found.as_ref().map_or(SEVERAL, |found| found.note),
            closed_form: exact.map(|velocity| {
                let energy = 0.5 * scene.mass * velocity * velocity;
                ClosedCriticalJson {
                    critical_velocity_m_s: velocity,
                    critical_energy_j: energy,
                    dimensionless_energy: dimensionless(energy),
                }
            }),
            relative_error: exact.map(|exact| if shown == exact { 0.0 } else { ((shown - exact) / exact).abs() }),
            eq15: Eq15Json::new(&scene),
            enclosure,
            sides: sides.iter().map(|side| (side.parameter.to_string(), (side.low, side.high))).collect(),
            criteria: criteria(&scene, integrator),
            residual_velocity_at_limit_m_s: at_limit(&scene, found.as_ref(), integrator),
            uncertainty,
            skipped: no_spread.into_iter().collect(),
        };
        let is_open = data.enclosure.as_ref().is_some_and(|enclosure| enclosure.critical_velocity_m_s.is_none());
        let exit = if is_open { Exit::Undecided } else { Exit::Success };
        Ok(Answer { text: data.text(scene.criterion), data: Some(data), exit })
    }
}

/// V_c of `scene` by other criteria, if its own is `plug`.
fn criteria(scene: &Scene, integrator: &dyn Integrator) -> Vec<CriterionJson> {
    let found = |(criterion, other): (&'static str, Scene)| {
        let found = critical_velocity::of_scene(&other, integrator).ok();
        CriterionJson { criterion, critical_velocity_m_s: found.map(|found| found.velocity) }
    };
    scene.other_criteria().into_iter().map(found).collect()
}

/// The residual velocity (m/s) just above V_c, if the criterion is `plug`.
fn at_limit(scene: &Scene, found: Option<&CriticalVelocity>, integrator: &dyn Integrator) -> Option<f64> {
    let found = found.filter(|_| scene.plug.is_some())?;
    let above = found.velocity + 2.0 * found.error_bar.unwrap_or(0.0);
    Some(integrator.solve(&scene.resolve(above).ok()?, Detail::End).ok()?.end.velocity)
}

impl CriticalJson {
    fn text(&self, criterion: Criterion) -> String {
        let mut text = Text::titled(self.scene.title.as_deref());
        text.line(format!("  method     {}, perforation at {}", self.method.name, criterion.place()));
        let bar = self.error_bar_m_s.map_or(String::new(), |bar| format!(" +- {}", error_text(Some(bar))));
        if let (Some(velocity), Some(energy), Some(flights)) =
            (self.critical_velocity_m_s, self.critical_energy_j, self.evaluations)
        {
            text.line(format!("  V_c        {}{bar} m/s, {flights} flights", Shown(velocity)));
            if let Some(EnclosureJson { critical_velocity_m_s: proved }) = &self.enclosure {
                let shown = proved.map_or_else(
                    || "no proof was found that speeds below stop and speeds above perforate".to_owned(),
                    |(low, high)| format!("{} m/s", digits_between(low, high)),
                );
                for (path, (low, high)) in &self.sides {
                    text.line(format!("  box        {path} from {} to {}", Shown(*low), Shown(*high)));
                }
                text.line(format!("  proved     {shown}"));
            }
            text.line(format!("  E_c        {}", engineering(energy, "J")));
        }
        if self.critical_velocity_m_s.is_none()
            || self.perforating_velocities_m_s.iter().any(|(_, high)| high.is_some())
        {
            for (index, (low, high)) in self.perforating_velocities_m_s.iter().enumerate() {
                let head = if index == 0 { "  perforate  " } else { "             " };
                let high = high.map_or("and above".to_owned(), |high| format!("to {} m/s", Shown(high)));
                text.line(format!("{head}{} m/s {high}", Shown(*low)));
            }
        }
        if !self.note.is_empty() {
            text.wrapped("  note       ", self.note);
        }
        if let Some(exact) = &self.closed_form {
            let error = error_text(self.relative_error);
            text.line(format!("  exact      {} m/s, relative error {error}", Shown(exact.critical_velocity_m_s)));
        }
        self.skipped.iter().for_each(|note| text.wrapped("  note       ", note));
        if let Some(uncertainty) = &self.uncertainty {
            add_uncertainty(&mut text, uncertainty);
            self.scene.follows.iter().for_each(|sentence| text.wrapped("             ", sentence));
        }
        if let Some(residual) = self.residual_velocity_at_limit_m_s {
            text.line(format!("  V_r        {} m/s just above V_c", significant(residual)));
        }
        for (index, CriterionJson { criterion, critical_velocity_m_s }) in self.criteria.iter().enumerate() {
            let head = if index == 0 { "  V_c by" } else { "" };
            let velocity = critical_velocity_m_s.map_or("-".to_owned(), |velocity| format!("{} m/s", Shown(velocity)));
            text.line(format!("{head:13}{criterion:12} {velocity}"));
        }
        if let Some((ours, eq15)) = self.dimensionless_energy.zip(self.eq15.as_ref()) {
            eq15.add_to(&mut text, ours);
        }
        text.finish()
    }
}

/// Adds the uncertainty of V_c to `text`.
fn add_uncertainty(text: &mut Text, found: &Uncertainty) {
    text.line(format!("  spread     +- {:.4} m/s to first order", found.first_order));
    for Share { spread: Spread { parameter, relative, distribution }, share } in &found.spreads {
        let relative = significant(100.0 * relative);
        let relative =
            if relative.contains('.') { relative.trim_end_matches('0').trim_end_matches('.') } else { &relative };
        let (name, share) = (distribution.name(), 100.0 * share);
        text.line(format!("             {parameter} {relative} %, {name}: {share:.1} % of the variance"));
    }
    let [low, median, high] = found.quantiles;
    text.line(format!("  sampled    mean {:.4}, deviation {:.4} m/s", found.mean, found.deviation));
    text.line(format!("             95 % within {low:.3} to {high:.3} m/s, median {median:.3}"));
    let left_out = match found.inadmissible {
        0 => String::new(),
        count => format!(", {count} inadmissible or without one V_c left out"),
    };
    text.line(format!("             {} random scenes, seed {}{left_out}", found.samples, found.seed));
    let Design { probability, velocity_m_s, interval95_m_s, safety_factor } = found.design;
    let [low, high] = interval95_m_s.map(|end| end.map_or("no bound".to_owned(), |end| format!("{end:.3}")));
    let percent = significant(100.0 * probability);
    let percent = percent.trim_end_matches('0').trim_end_matches('.');
    text.line(format!("  design     {velocity_m_s:.3} m/s ({low} to {high} with 95 %)"));
    text.wrapped(
        "             ",
        &format!("{percent} % of the scenes lie below; safety factor on V_c {safety_factor:.4}"),
    );
}

impl Eq15Json {
    /// Adds the formula beside `ours`, the simulated E_c/(d³ fc).
    fn add_to(&self, text: &mut Text, ours: f64) {
        let row = |(name, value): (&str, f64)| {
            // A target without thickness needs no energy by either.
            let over = match 100.0 * (ours / value - 1.0) {
                percent if !percent.is_finite() => "-".to_owned(),
                percent if percent.abs() < 1e6 => format!("{percent:+.1} %"),
                percent => format!("{percent:+.1e} %"),
            };
            [name.to_owned(), significant(value), over]
        };
        let simulation = ["simulation".to_owned(), significant(ours), String::new()];
        let formulas = [("Eq. 15, printed", self.printed), ("Eq. 15, unrounded", self.unrounded)].map(row);
        text.gap();
        text.table(&["E_c/(d³ fc)", "value", "simulation over it"], [simulation].into_iter().chain(formulas));
        if !self.valid {
            text.wrapped("  ", &format!("Eq. 15 does not apply: {}", self.note));
        }
    }
}
