//! Where a run took place and what remakes it: the reproduction block of a report.

use std::fs;

use schemars::JsonSchema;
use serde::Serialize;

use crate::suite::Suite;

/// The lock file that the program was built with.
const LOCK_FILE: &str = include_str!("../../Cargo.lock");

/// Versions, machine, inputs.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Environment {
    /// Version of the program.
    pub version: &'static str,
    /// Commit that it was built from.
    pub commit: &'static str,
    /// Compiler.
    pub rustc: &'static str,
    /// Target triple.
    pub target: &'static str,
    /// Build profile.
    pub profile: &'static str,
    /// Features that change what is run.
    pub features: Vec<&'static str>,
    /// BLAKE3 of the lock file.
    pub lock_file_hash: String,
    /// BLAKE3 of the suite, where one was run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub suite_hash: Option<String>,
    /// BLAKE3 of the scenes as they were understood, in SI units.
    pub scenes_hash: String,
    /// Processor.
    pub cpu: String,
    /// Threads used.
    pub threads: usize,
    /// Floating point: rounding, subnormal numbers, fused multiply-add.
    pub floating_point: String,
    /// Seed of every random number.
    pub seed: u64,
    /// The command that remakes the run.
    pub command: String,
    /// Other programs, by the name that claims use.
    pub peers: Vec<(String, String)>,
    /// When it ran, UTC.
    pub date: String,
}

impl Environment {
    /// This program, on this machine, now.
    pub fn here(seed: u64, command: String, suite: &Suite, peers: Vec<(String, String)>) -> Self {
        let scenes = format!("{:?}", suite.scenes.iter().collect::<Vec<_>>());
        Self { suite_hash: Some(hash(&suite.text)), ..Self::of_scenes(seed, command, &scenes, peers) }
    }

    /// This program, on this machine, now, where no suite is run; `scenes` is what was understood of them.
    pub fn of_scenes(seed: u64, command: String, scenes: &str, peers: Vec<(String, String)>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: env!("PENETRODE_COMMIT"),
            rustc: env!("PENETRODE_RUSTC"),
            target: env!("PENETRODE_TARGET"),
            profile: env!("PENETRODE_PROFILE"),
            features: [("diffsol", cfg!(feature = "diffsol"))]
                .into_iter()
                .filter_map(|(name, on)| on.then_some(name))
                .collect(),
            lock_file_hash: hash(LOCK_FILE),
            suite_hash: None,
            scenes_hash: hash(scenes),
            cpu: cpu(),
            threads: rayon::current_num_threads(),
            floating_point: floating_point(),
            seed,
            command,
            peers,
            date: utc_now(),
        }
    }
}

/// BLAKE3 of a text, in hexadecimal.
pub fn hash(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

/// Name of the processor, where the system states it.
fn cpu() -> String {
    fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            text.lines()
                .find(|line| line.starts_with("model name"))
                .and_then(|line| line.split_once(':'))
                .map(|(_, name)| name.trim().to_owned())
        })
        .unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// What the arithmetic does, found by trying.
fn floating_point() -> String {
    use std::hint::black_box;
    let third = black_box(1.0_f64) / black_box(3.0);
    let nearest = black_box(1.0_f64) + black_box(f64::EPSILON / 2.0) == 1.0 && (third * 3.0 - 1.0) == 0.0;
    let subnormal = black_box(f64::MIN_POSITIVE) / black_box(2.0) > 0.0;
    let fused = cfg!(target_feature = "fma");
    format!(
        "IEEE 754 binary64, {}, subnormal numbers {}, fused multiply-add {}",
        if nearest { "round to nearest even" } else { "NOT rounding to nearest" },
        if subnormal { "kept" } else { "FLUSHED" },
        if fused { "used" } else { "not used" },
    )
}

/// Date and time of day in UTC, `YYYY-MM-DDThh:mm:ssZ`.
fn utc_now() -> String {
    let seconds =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |elapsed| elapsed.as_secs());
    utc(seconds)
}

/// Seconds since 1970 as `YYYY-MM-DDThh:mm:ssZ`, proleptic Gregorian (Fliegel and Van Flandern 1968).
fn utc(seconds: u64) -> String {
    let (days, rest) = ((seconds / 86_400).cast_signed(), seconds % 86_400);
    let l = days + 2_440_588 + 68_569;
    let n = 4 * l / 146_097;
    let l = l - (146_097 * n + 3) / 4;
    let i = 4000 * (l + 1) / 1_461_001;
    let l = l - 1461 * i / 4 + 31;
    let j = 80 * l / 2447;
    let day = l - 2447 * j / 80;
    let l = j / 11;
    let month = j + 2 - 12 * l;
    let year = 100 * (n - 49) + i + l;
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_known_instants() {
        assert_eq!(utc(0), "1970-01-01T00:00:00Z");
        assert_eq!(utc(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(utc(1_709_251_199), "2024-02-29T23:59:59Z");
    }
}
