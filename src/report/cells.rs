//! Tables that a terminal and a page both show: the same cells, laid out by either.

use super::text::{count, number, one_line, or_dash};
use crate::studies::bench::growth::Growth;
use crate::studies::experiments::{Comparison, SetSummary};
use crate::studies::extreme_scenes::{Summary, Tally};

/// Columns of [`sets`].
pub const SETS: [&str; 12] = [
    "set",
    "tests",
    "median",
    "spread",
    "range",
    "within ±20 %",
    "outliers",
    "in range of S",
    "mean E/D",
    "95 % of it",
    "u_val/D",
    "|E| <= u_val",
];

/// Predicted over measured depth and the comparison error E/D, set by set.
pub fn sets(sets: &[SetSummary]) -> impl Iterator<Item = [String; 12]> {
    sets.iter().map(|set| {
        let percent = |value: f64| format!("{:+.1}", 100.0 * value);
        [
            one_line(&set.set),
            set.experiments.to_string(),
            format!("{:.2}", set.median),
            or_dash(set.spread, |spread| format!("{spread:.2}")),
            format!("{:.2} to {:.2}", set.least, set.greatest),
            set.within_20_percent.to_string(),
            set.outliers.to_string(),
            set.in_range_of_fit.to_string(),
            format!("{} %", percent(set.mean_comparison_error)),
            set.mean_comparison_error95
                .map_or("-".to_owned(), |[low, high]| format!("{} to {} %", percent(low), percent(high))),
            set.validation_uncertainty.map_or("not given".to_owned(), |u| format!("{:.1} %", 100.0 * u)),
            match set.with_validation_uncertainty {
                0 => "-".to_owned(),
                given => format!("{} of {given}", set.within_validation_uncertainty),
            },
        ]
    })
}

/// The terms of the validation uncertainty after ASME V&V 20, and what is known of each.
pub fn uncertainties(comparisons: &[Comparison]) -> [(&'static str, String); 3] {
    let numerical = comparisons.iter().map(|c| c.numerical_uncertainty_m / c.predicted_depth_m).fold(0.0, f64::max);
    let given = |get: fn(&Comparison) -> Option<f64>, remedy| match comparisons.iter().filter_map(get).count() {
        0 => format!("not given{remedy}"),
        some => format!("given for {some} of {}", count(comparisons.len(), "test")),
    };
    [
        ("u_num, numerical", format!("{} of the depth at most", number(numerical, 2))),
        ("u_input, inputs", given(|c| c.input_uncertainty_m, " (`experiments --spread` states one)")),
        ("u_D, data", given(|c| c.experiment.data_uncertainty_m, " by the sources")),
    ]
}

/// Columns of [`outcomes`].
pub const OUTCOMES: [&str; 5] = ["outcomes of", "right", "undecided", "refused", "wrong"];

/// The outcomes of each method over random scenes.
pub fn outcomes(summary: &Summary) -> impl Iterator<Item = [String; 5]> {
    summary.tallies.iter().map(|(method, &Tally { right, undecided, refused, wrong })| {
        let [right, undecided, refused, wrong] = [right, undecided, refused, wrong].map(|count| count.to_string());
        [method.name().to_owned(), right, undecided, refused, wrong]
    })
}

/// Columns of [`worst`].
pub const WORST: [&str; 4] = ["worst error", "quantity", "ulp x condition", "scene"];

/// The worst errors over random scenes and the scenes that make them.
pub fn worst(summary: &Summary) -> impl Iterator<Item = [String; 4]> {
    summary.worst.iter().map(|((method, quantity), worst)| {
        [method.name().to_owned(), quantity.name().to_owned(), number(worst.units, 3), worst.index.to_string()]
    })
}

/// Columns of [`growth`].
pub const GROWTH: [&str; 6] = ["scenes", "source", "threads", "time [s]", "a scene [µs]", "peak memory [MB]"];

/// Time and memory of `batch` as work grows.
pub fn growth(growth: &[Growth]) -> impl Iterator<Item = [String; 6]> {
    growth.iter().map(|g| {
        [
            g.scenes.to_string(),
            format!("{:?}", g.source).to_lowercase(),
            g.threads.to_string(),
            number(g.seconds, 3),
            number(g.microseconds_a_scene(), 3),
            or_dash(g.peak_megabytes(), |megabytes| number(megabytes, 3)),
        ]
    })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
mod tests {
    use super::*;
    use crate::integrators::MethodName;
    use crate::studies::bench::growth::Source;

    #[test]
    fn each_count_of_outcomes_stands_under_its_name() {
        let tally = Tally { right: 5, undecided: 2, refused: 3, wrong: 4 };
        let summary = Summary { tallies: [(MethodName::Taylor, tally)].into(), ..Summary::default() };
        let rows: Vec<_> = outcomes(&summary).collect();
        let named = serde_json::to_value(tally).unwrap();
        for (name, cell) in OUTCOMES.iter().zip(&rows[0]).skip(1) {
            assert_eq!(named[name].to_string(), *cell, "{name}");
        }
    }

    #[test]
    fn growth_is_shown_in_seconds_microseconds_and_megabytes() {
        let row = Growth {
            scenes: 1000,
            threads: 2,
            source: Source::File,
            seconds: 0.0055,
            ns_a_scene: 5500.0,
            peak_bytes: Some(11_200_000),
            runs: 3,
        };
        let shown = growth(&[row]).collect::<Vec<_>>();
        assert_eq!(shown, [["1000", "file", "2", "0.0055", "5.5", "11.2"].map(str::to_owned)]);
    }
}
