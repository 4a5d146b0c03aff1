//! Do predicted depths agree with measured ones, and what does that validate?
//!
//! Each experiment becomes a scene: S = 72 (fc/MPa)^-1/2, k = 0.707 + h/d and N* from the nose, semi-infinite. Its rest
//! depth is compared with the measured one, set by set.
//!
//! After ASME V&V 20 the comparison error is `E = S - D` (simulation less data) and the validation uncertainty
//! `u_val² = u_num² + u_input² + u_D²`. Of these only u_num is ours. None of the shipped sources states u_D or the
//! uncertainty of its inputs: u_val is then *not given*, and E alone is reported.
//!
//! **The shipped data validate** the depth of small projectiles in thick targets within the range that S was fitted to.
//! **They do not validate** a critical velocity, perforation, Eq. 15 or larger projectiles. A published series of 13 kg,
//! 76 mm projectiles, not among these files, fails the S law: predicted over measured is 0.57 to 0.69 there.

pub mod ballistic_limit;
pub mod perforation;
pub mod resistance;
pub mod shot;
pub mod statistics;
pub mod strength;

pub use shot::{EXPERIMENTS, Shot, Shots};

use serde::Serialize;
use statistics::Sample;
use thiserror::Error;

use super::applicability::model_error;
use super::error::{Studied, StudyError};
use super::sensitivity::{Spread, input_uncertainty};
use crate::exchange::tables::TableError;
use crate::integrators::{ClosedForm, Detail, Integrator};
use crate::physics::Parameter;
use crate::physics::groups::Groups;
use crate::physics::{Advice, Concrete, Scene};

/// The measured data that ship: file name and content.
pub const SHIPPED: [(&str, &str); 5] = [
    ("forrestal1994_penetration.csv", include_str!("../../verification/experiments/forrestal1994_penetration.csv")),
    ("forrestal1996_penetration.csv", include_str!("../../verification/experiments/forrestal1996_penetration.csv")),
    ("huang2011_penetration.csv", include_str!("../../verification/experiments/huang2011_penetration.csv")),
    ("oneil1999_vhsc_penetration.csv", include_str!("../../verification/experiments/oneil1999_vhsc_penetration.csv")),
    (
        "sliter1980_collection_penetration.csv",
        include_str!("../../verification/experiments/sliter1980_collection_penetration.csv"),
    ),
];

/// What the shipped data validate, and what not: for the terminal and the report.
pub const MEANING: &str = include_str!("experiments/meaning.txt").trim_ascii_end();

/// Relative depth X/d below which an experiment stands apart: the crater law does not apply (Li & Chen 2003, Eq. 27).
pub const SHALLOW: f64 = 0.5;

/// A fair tolerance in depth within the range of the fit of S.
pub const BAND: f64 = 0.2;

/// One measured experiment, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Experiment {
    /// Name of its set.
    pub set: String,
    /// Line in its file, from 1.
    pub line: u64,
    /// Projectile mass (kg).
    #[serde(skip)]
    pub mass: f64,
    /// Projectile and target, S of Eq. 14, k = 0.707 + h/d of the nose, B = 1.
    #[serde(skip)]
    pub concrete: Concrete,
    /// Thickness of the target (m), where it is known; the depth is that without a far side.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "report", schemars(default))]
    pub thickness_m: Option<f64>,
    /// Impact velocity (m/s).
    pub velocity_m_s: f64,
    /// Measured depth (m).
    pub measured_depth_m: f64,
    /// Standard uncertainty of the measured depth u_D (m), where the source gives it.
    pub data_uncertainty_m: Option<f64>,
}

/// The shots of all shipped files.
///
/// # Errors
/// [`TableError`]: never, as a test shows.
pub fn shipped_shots() -> Result<Vec<Shot>, Box<TableError>> {
    let mut all = Vec::new();
    for (name, text) in SHIPPED {
        all.extend(shot::read(name, text.as_bytes(), name)?.shots);
    }
    Ok(all)
}

/// The depths that they measure, excluded ones left out.
///
/// # Errors
/// As [`shipped_shots`].
pub fn shipped() -> Result<Vec<Experiment>, Box<TableError>> {
    Ok(depths(&shipped_shots()?))
}

/// The depths that `shots` measure, excluded ones left out.
pub fn depths(shots: &[Shot]) -> Vec<Experiment> {
    shots.iter().filter(|shot| shot.excluded.is_none()).filter_map(Shot::experiment).collect()
}

impl Experiment {
    /// Its scene, with another k where `crater_ratio` is given.
    pub fn scene(&self, crater_ratio: Option<f64>) -> Scene {
        let crater_ratio = crater_ratio.unwrap_or(self.concrete.crater_ratio);
        let concrete = Concrete { crater_ratio, ..self.concrete.clone() };
        Scene { velocity: Some(self.velocity_m_s), ..Scene::of_concrete(self.mass, concrete) }
    }

    /// What of it lies outside the experiments of Eq. 14, where its S is left to that.
    pub fn outside_eq14(&self) -> Vec<String> {
        let follows = self.concrete.follows_eq14;
        if follows { self.concrete.use_of_eq14(self.velocity_m_s).departures() } else { Vec::new() }
    }

    /// True if it lies in the range to which S was fitted.
    pub fn is_in_range_of_fit(&self) -> bool {
        self.concrete.use_of_eq14(self.velocity_m_s).is_in_range()
    }
}

/// An experiment on the map of Eq. 11-12.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct MarkedScene {
    /// Name of its set.
    pub set: String,
    /// Impact function I.
    #[serde(rename = "I")]
    pub impact: f64,
    /// Geometry function N.
    #[serde(rename = "N")]
    pub geometry: f64,
    /// Crater depth in diameters, by its own nose.
    #[serde(rename = "k")]
    pub crater_ratio: f64,
    /// Error of Eq. 11-12 there, relative to the depth of the equation of motion.
    pub error: f64,
}

/// Where `experiments` stand on the map; those without drag, whose N is infinite, are left out.
pub fn marked(experiments: &[Experiment]) -> Vec<MarkedScene> {
    let place = |experiment: &Experiment| {
        let groups = Groups::of(&experiment.scene(None), experiment.velocity_m_s)?;
        let (impact, geometry, crater_ratio) = (groups.impact, groups.geometry?, experiment.concrete.crater_ratio);
        let error = model_error(impact, Some(geometry), crater_ratio);
        Some(MarkedScene { set: experiment.set.clone(), impact, geometry, crater_ratio, error })
    };
    experiments.iter().filter_map(place).collect()
}

/// An experiment beside its prediction.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Comparison {
    /// The experiment.
    #[serde(flatten)]
    pub experiment: Experiment,
    /// Predicted depth (m).
    pub predicted_depth_m: f64,
    /// Predicted over measured depth.
    pub ratio: f64,
    /// Impact function I.
    #[serde(rename = "I")]
    pub impact: f64,
    /// Geometry function N; `None` without drag.
    #[serde(rename = "N")]
    pub geometry: Option<f64>,
    /// Crater depth in diameters.
    #[serde(rename = "k")]
    pub crater_ratio: f64,
    /// Comparison error E = S - D (m).
    pub comparison_error_m: f64,
    /// Numerical uncertainty u_num (m): the method's difference from the closed form, at least its last bit.
    pub numerical_uncertainty_m: f64,
    /// Uncertainty of the prediction from the stated input spreads u_input (m); `None` where none is stated.
    pub input_uncertainty_m: Option<f64>,
    /// Validation uncertainty u_val (m); `None`, not given, unless the source gives u_D and the inputs have spreads.
    pub validation_uncertainty_m: Option<f64>,
    /// E - u_val to E + u_val (m), which holds the error of the model; `None` without u_val.
    pub model_error_interval_m: Option<[f64; 2]>,
    /// Whether |E| <= u_val: then what is left of the error of the model is not seen in the noise. `None` without u_val.
    pub within_validation_uncertainty: Option<bool>,
    /// Whether its ratio is an outlier of its set ([`statistics`]).
    pub is_outlier: bool,
    /// What of it lies outside the experiments of Eq. 14.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "report", schemars(default))]
    pub outside_eq14: Vec<String>,
}

impl Comparison {
    /// True if the measured depth is below half a diameter.
    pub fn is_shallow(&self) -> bool {
        self.experiment.measured_depth_m < SHALLOW * self.experiment.concrete.diameter
    }

    /// Set, shallow experiments apart.
    pub fn group(&self) -> String {
        let set = &self.experiment.set;
        if self.is_shallow() { format!("{set}, X/d < {SHALLOW}") } else { set.clone() }
    }
}

/// Why an experiment could not be predicted.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line} of {set}: {cause}")]
pub struct PredictionError {
    /// Set of the experiment.
    pub set: String,
    /// Its line.
    pub line: u64,
    /// What happened.
    pub cause: Box<StudyError>,
}

impl Advice for PredictionError {
    fn inner(&self) -> Option<&dyn Advice> {
        match &*self.cause {
            StudyError::Integration(cause) if !cause.is_usage() => Some(cause),
            _ => None,
        }
    }

    fn help(&self) -> String {
        self.inner().map_or_else(|| "check the numbers of that row".to_owned(), Advice::help)
    }
}

/// Predicts every experiment through `integrator`, with `spreads` of the inputs for u_input.
///
/// # Errors
/// [`PredictionError`] of the first experiment without a prediction.
pub fn compare(
    experiments: &[Experiment],
    crater_ratio: Option<f64>,
    spreads: &[Spread],
    integrator: &dyn Integrator,
) -> Result<Vec<Comparison>, PredictionError> {
    let predicted = experiments.iter().map(|experiment| {
        predict(experiment, crater_ratio, spreads, integrator).map_err(|cause| PredictionError {
            set: experiment.set.clone(),
            line: experiment.line,
            cause: Box::new(cause),
        })
    });
    let mut comparisons = predicted.collect::<Result<Vec<Comparison>, _>>()?;
    let places = grouped(0..comparisons.len(), |index| comparisons[*index].group());
    for (_, places) in places {
        let ratios: Vec<f64> = places.iter().map(|&place| comparisons[place].ratio).collect();
        for (place, is_outlier) in places.into_iter().zip(statistics::outliers(&ratios)) {
            comparisons[place].is_outlier = is_outlier;
        }
    }
    Ok(comparisons)
}

fn predict(
    experiment: &Experiment,
    crater_ratio: Option<f64>,
    spreads: &[Spread],
    integrator: &dyn Integrator,
) -> Studied<Comparison> {
    let scene = experiment.scene(crater_ratio);
    let problem = scene.problem()?;
    let predicted_depth_m = integrator.solve(&problem, Detail::End)?.end.depth;
    let exact = ClosedForm.solve(&problem, Detail::End)?.end.depth;
    let groups = Groups::of(&scene, experiment.velocity_m_s);
    let input_uncertainty_m = input_uncertainty(&scene, spreads, |entry| entry.depth)?;
    let numerical_uncertainty_m = (predicted_depth_m - exact).abs().max(f64::EPSILON * exact);
    let others = experiment.data_uncertainty_m.zip(input_uncertainty_m);
    let comparison_error_m = predicted_depth_m - experiment.measured_depth_m;
    let validation_uncertainty_m = others.map(|(data, input)| numerical_uncertainty_m.hypot(data).hypot(input));
    Ok(Comparison {
        predicted_depth_m,
        ratio: predicted_depth_m / experiment.measured_depth_m,
        impact: groups.map_or(f64::NAN, |groups| groups.impact),
        geometry: groups.and_then(|groups| groups.geometry),
        crater_ratio: Parameter::CraterRatio.get(&scene).unwrap_or(f64::NAN),
        comparison_error_m,
        numerical_uncertainty_m,
        input_uncertainty_m,
        validation_uncertainty_m,
        model_error_interval_m: validation_uncertainty_m.map(|u| [comparison_error_m - u, comparison_error_m + u]),
        within_validation_uncertainty: validation_uncertainty_m.map(|u| comparison_error_m.abs() <= u),
        is_outlier: false,
        outside_eq14: experiment.outside_eq14(),
        experiment: experiment.clone(),
    })
}

/// How a set of experiments came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct SetSummary {
    /// Set, shallow experiments apart.
    pub set: String,
    /// Number of experiments.
    #[serde(rename = "shots")]
    pub experiments: usize,
    /// Median of predicted over measured depth.
    pub median: f64,
    /// Sample standard deviation of predicted over measured depth, about the mean of the set itself; `null` for one.
    pub spread: Option<f64>,
    /// 95 % interval of `spread`.
    pub spread95: Option<[f64; 2]>,
    /// Least of predicted over measured depth.
    pub least: f64,
    /// Greatest of predicted over measured depth.
    pub greatest: f64,
    /// Experiments within ±20 %.
    pub within_20_percent: usize,
    /// Experiments in the range to which S was fitted.
    pub in_range_of_fit: usize,
    /// Mean of E/D, the comparison error E = S - D relative to the measured depth (ASME V&V 20).
    pub mean_comparison_error: f64,
    /// 95 % interval of the mean of E/D, the bias.
    pub mean_comparison_error95: Option<[f64; 2]>,
    /// Root mean square of u_val/D; `null`, not given, unless every experiment has it.
    pub validation_uncertainty: Option<f64>,
    /// Experiments with u_val.
    pub with_validation_uncertainty: usize,
    /// Of these, |E| <= u_val.
    pub within_validation_uncertainty: usize,
    /// Outliers.
    pub outliers: usize,
}

/// Sets in the order in which they appear, shallow experiments apart.
pub fn summaries(comparisons: &[Comparison]) -> Vec<SetSummary> {
    let groups = grouped(comparisons, |comparison| comparison.group()).into_iter();
    groups.map(|(group, of_group)| summary(group, &of_group)).collect()
}

/// `items` by `key`, groups in the order in which they first appear.
pub fn grouped<T: Copy, K: PartialEq>(items: impl IntoIterator<Item = T>, key: impl Fn(&T) -> K) -> Vec<(K, Vec<T>)> {
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

/// `of_group` has at least one comparison.
fn summary(set: String, of_group: &[&Comparison]) -> SetSummary {
    let mut ratios: Vec<f64> = of_group.iter().map(|c| c.ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let experiments = ratios.len();
    let count = experiments as f64;
    let Some(sample) = Sample::of(&ratios) else { unreachable!("a group has a member") };
    let mean = sample.mean;
    let relative: Option<Vec<f64>> =
        of_group.iter().map(|c| Some(c.validation_uncertainty_m? / c.experiment.measured_depth_m)).collect();
    SetSummary {
        set,
        experiments,
        median: statistics::median(&ratios),
        spread: sample.deviation,
        spread95: sample.deviation95,
        least: ratios[0],
        greatest: ratios[experiments - 1],
        within_20_percent: ratios.iter().filter(|ratio| (*ratio - 1.0).abs() <= BAND).count(),
        in_range_of_fit: of_group.iter().filter(|c| c.experiment.is_in_range_of_fit()).count(),
        mean_comparison_error: mean - 1.0,
        mean_comparison_error95: sample.mean95.map(|ends| ends.map(|end| end - 1.0)),
        validation_uncertainty: relative.map(|all| (all.iter().map(|u| u * u).sum::<f64>() / count).sqrt()),
        with_validation_uncertainty: of_group.iter().filter(|c| c.within_validation_uncertainty.is_some()).count(),
        within_validation_uncertainty: of_group
            .iter()
            .filter(|c| c.within_validation_uncertainty == Some(true))
            .count(),
        outliers: of_group.iter().filter(|c| c.is_outlier).count(),
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::Taylor;

    fn compared(crater_ratio: Option<f64>) -> Vec<Comparison> {
        compare(&shipped().unwrap(), crater_ratio, &[], &Taylor::default()).unwrap()
    }

    fn read(table: &str) -> Result<Vec<Experiment>, Box<TableError>> {
        Ok(depths(&shot::read("own.csv", table.as_bytes(), "own")?.shots))
    }

    fn of(summaries: &[SetSummary], group: &str) -> SetSummary {
        summaries.iter().find(|s| s.set == group).unwrap().clone()
    }

    #[test]
    fn predictions_are_those_computed_for_the_files_elsewhere() {
        let all: Vec<_> = shipped_shots().unwrap().iter().filter_map(Shot::experiment).collect();
        let experiments = compare(&all, None, &[], &Taylor::default()).unwrap();
        let mut index = 0;
        for (name, text) in SHIPPED {
            let mut reader = csv::Reader::from_reader(text.as_bytes());
            let place = reader.headers().unwrap().iter().position(|c| c == "calc_ratio_LiChen_S72").unwrap();
            for record in reader.records() {
                let theirs: f64 = record.unwrap()[place].parse().unwrap();
                let ours = experiments[index].ratio;
                // Printed with three decimals.
                assert!(
                    (ours - theirs).abs() <= 5.1e-4,
                    "{name} line {}: {ours} {theirs}",
                    experiments[index].experiment.line
                );
                index += 1;
            }
        }
        assert_eq!(index, 107);
    }

    /// Medians and sample deviations by Python's `statistics` of the ratios in the files, which have three decimals.
    #[test]
    fn medians_and_spreads_of_the_sets_are_those_expected() {
        let found = summaries(&compared(None));
        for (group, experiments, median, spread, within) in [
            ("Forrestal1994", 16, 1.008, 0.0726, 16),
            ("Forrestal1996", 40, 1.0175, 0.0937, 39),
            ("HuangMR2011", 8, 1.0145, 0.0443, 8),
            ("ONeil1999", 8, 1.0015, 0.1045, 7),
            ("Sliter1980", 26, 0.8645, 0.1071, 21),
            ("Sliter1980, X/d < 0.5", 7, 2.619, 1.5625, 1),
        ] {
            let s = of(&found, group);
            assert_eq!((s.experiments, s.within_20_percent), (experiments, within), "{group}");
            assert!((s.median - median).abs() <= 6e-4 && (s.spread.unwrap() - spread).abs() <= 6e-4, "{s:?}");
        }
    }

    #[test]
    fn rows_that_their_table_excludes_are_in_no_statistics() {
        let shots = shipped_shots().unwrap();
        let excluded: Vec<_> =
            shots.iter().filter(|shot| shot.excluded.is_some()).map(|s| (s.set.as_str(), s.line)).collect();
        assert_eq!(excluded, [("Forrestal1994", 8), ("Forrestal1996", 14)]);
        assert_eq!((shots.len(), shipped().unwrap().len()), (107, 105));
    }

    #[test]
    fn crater_depth_of_the_paper_is_poor_for_flat_noses() {
        let s = of(&summaries(&compared(Some(2.0))), "Sliter1980");
        assert!((s.median - 1.434).abs() <= 6e-4 && (s.spread.unwrap() - 0.1738).abs() <= 6e-4, "{s:?}");
    }

    #[test]
    fn validation_uncertainty_is_not_given_unless_the_source_gives_the_data_s() {
        assert!(summaries(&compared(None)).iter().all(|s| s.validation_uncertainty.is_none()));
        let table = "M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,V0_m_s,depth_mm,depth_uncertainty_mm\n\
                     0.906,26.9,ogive,2,35.2,2370,277,173,5\n";
        let experiments = read(table).unwrap();
        let spreads = ["projectile.mass=1%".parse().unwrap()];
        let with = compare(&experiments, None, &spreads, &Taylor::default()).unwrap();
        let input = with[0].input_uncertainty_m.unwrap();
        let total = with[0].validation_uncertainty_m.unwrap();
        assert!(input > 0.0 && (total * total - input * input - 25e-6).abs() < 1e-12, "{input} {total}");
        assert!(compare(&experiments, None, &[], &Taylor::default()).unwrap()[0].validation_uncertainty_m.is_none());
    }

    #[test]
    fn numerical_uncertainty_is_round_off() {
        for c in compared(None) {
            assert!(c.numerical_uncertainty_m / c.predicted_depth_m < 1e-13, "{c:?}");
        }
    }

    #[test]
    fn cells_that_cannot_be_used_are_refused_with_line_and_column() {
        let header = "M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,V0_m_s,depth_mm\n";
        let good = "0.906,26.9,ogive,2,35.2,2370,277,173\n";
        assert_eq!(read(&format!("{header}{good}")).unwrap()[0].set, "own");
        for (from, to, message) in [
            ("173", "deep", "own.csv:3, column 8: `deep` in `depth_mm` is not a number"),
            (",2,", ",,", "own.csv:3, column 4: the cell in `CRH` is empty"),
            ("0.906", "-1", "own.csv:3, column 1: `-1` in `M_kg` is not a number > 0"),
            ("277", "NaN", "own.csv:3, column 7: `NaN` in `V0_m_s` is not a number > 0"),
        ] {
            let table = format!("{header}{good}{}", good.replace(from, to));
            let found = shot::read("own.csv", table.as_bytes(), "own").unwrap();
            let error = found.refused[0].to_string();
            assert!(error.starts_with(message) && found.shots.len() == 1, "{error}");
            // Alone it leaves no shot.
            assert!(read(&format!("{header}{}", good.replace(from, to))).is_err());
        }
    }
}
