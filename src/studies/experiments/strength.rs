//! Does the agreement depend on the strength of the concrete? Predicted over measured depth of each set, strength by strength.

use serde::Serialize;

use super::statistics::Sample;
use super::{Comparison, grouped};

/// Strengths within this ratio of the least count as one.
const ONE_STRENGTH: f64 = 1.1;

/// The depths of a set in concrete of one strength.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct StrengthSummary {
    /// Set, shallow experiments apart.
    pub set: String,
    /// Least and greatest strength (Pa).
    pub strength_pa: [f64; 2],
    /// Predicted over measured depth.
    pub ratio: Sample,
    /// Experiments in the range to which S was fitted.
    pub in_range_of_fit: usize,
}

/// Each set by strength, ascending.
pub fn by_strength(comparisons: &[Comparison]) -> Vec<StrengthSummary> {
    let mut all = Vec::new();
    for (set, mut members) in grouped(comparisons, |comparison| comparison.group()) {
        let strength = |comparison: &Comparison| comparison.experiment.concrete.strength;
        members.sort_by(|a, b| strength(a).total_cmp(&strength(b)));
        let mut rest = members.as_slice();
        while let Some(first) = rest.first() {
            let end = rest.partition_point(|member| strength(member) <= ONE_STRENGTH * strength(first));
            let (of_one, others) = rest.split_at(end);
            let ratios: Vec<f64> = of_one.iter().map(|comparison| comparison.ratio).collect();
            all.extend(Sample::of(&ratios).map(|ratio| StrengthSummary {
                set: set.clone(),
                strength_pa: [strength(of_one[0]), strength(of_one[end - 1])],
                ratio,
                in_range_of_fit: of_one.iter().filter(|c| c.experiment.is_in_range_of_fit()).count(),
            }));
            rest = others;
        }
    }
    all
}
