//! The time of a piece of work: median and quartiles over samples, warmed.

use std::time::Instant;

use schemars::JsonSchema;
use serde::Serialize;

/// Shortest sample (ns); shorter work is repeated within one, so that the clock does not count.
const SAMPLE_NS: f64 = 100_000.0;

/// Longest time that the samples of one piece of work take together (ns), but for the first.
const TOGETHER_NS: f64 = 1e9;

/// A measured time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Timing {
    /// Median of the samples (ns).
    pub median_ns: f64,
    /// A quarter of the samples lies below (ns).
    pub low_ns: f64,
    /// A quarter of the samples lies above (ns).
    pub high_ns: f64,
    /// Samples taken.
    pub samples: usize,
}

impl Timing {
    /// Median and quartiles of `samples` (ns); `None` without any.
    pub fn of(mut samples: Vec<f64>) -> Option<Self> {
        samples.sort_by(f64::total_cmp);
        let last = samples.len().checked_sub(1)?;
        // Between two samples in proportion, as the median of an even number has it.
        let at = |share: f64| {
            let place = share * last as f64;
            let below = samples[place.floor() as usize];
            below + (samples[place.ceil() as usize] - below) * place.fract()
        };
        Some(Self { median_ns: at(0.5), low_ns: at(0.25), high_ns: at(0.75), samples: samples.len() })
    }

    /// The time of one of `count` equal parts.
    #[must_use]
    pub fn over(self, count: usize) -> Self {
        let per = 1.0 / count.max(1) as f64;
        Self { median_ns: self.median_ns * per, low_ns: self.low_ns * per, high_ns: self.high_ns * per, ..self }
    }
}

/// The effort of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Samples of each time, at least one; fewer where one alone takes long.
    pub samples: usize,
}

impl Effort {
    /// The time of `work`, which has run at least once before: caches and branches are warm.
    pub fn time(self, work: &mut dyn FnMut()) -> Timing {
        let first = elapsed(1, work);
        let inner = (SAMPLE_NS / first.max(1.0)).ceil().clamp(1.0, 1e6) as usize;
        let fitting = (TOGETHER_NS / (first * inner as f64).max(1.0)) as usize;
        let samples = self.samples.min(fitting).max(1);
        // What takes long is timed once: the first time is the sample.
        let samples =
            if samples == 1 && inner == 1 { vec![first] } else { (0..samples).map(|_| elapsed(inner, work)).collect() };
        Timing::of(samples).unwrap_or(Timing { median_ns: first, low_ns: first, high_ns: first, samples: 1 })
    }
}

/// Time of one of `count` runs (ns).
fn elapsed(count: usize, work: &mut dyn FnMut()) -> f64 {
    let started = Instant::now();
    for _ in 0..count {
        work();
    }
    started.elapsed().as_nanos() as f64 / count as f64
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn the_median_and_the_quartiles_of_known_samples() {
        let timing = Timing::of(vec![4.0, 1.0, 3.0, 2.0, 5.0]).unwrap();
        assert_eq!((timing.low_ns, timing.median_ns, timing.high_ns, timing.samples), (2.0, 3.0, 4.0, 5));
        assert_eq!(Timing::of(vec![1.0, 2.0]).unwrap().median_ns, 1.5);
        assert_eq!(Timing::of(Vec::new()), None);
        assert_eq!(timing.over(2).median_ns, 1.5);
    }

    #[test]
    fn short_work_is_repeated_within_a_sample_and_long_work_is_not_repeated_at_all() {
        let count = |samples, pause: u64| {
            let mut runs = 0_u32;
            let timing = Effort { samples }.time(&mut || {
                runs += 1;
                std::thread::sleep(std::time::Duration::from_micros(pause));
            });
            (runs, timing.samples)
        };
        let (runs, samples) = count(5, 0);
        assert!(runs > 5 && samples == 5, "{runs} runs, {samples} samples");
        assert_eq!(count(1, 1000), (1, 1));
    }
}
