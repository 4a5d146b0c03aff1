//! Where a run took place and what remakes it: the reproduction block of a report.

use std::fs;

use chrono::Utc;
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
    /// Whether what it was built from was that commit (`clean`) or was changed since (`changed`); `unknown` without a repository.
    pub tree: &'static str,
    /// Compiler.
    pub rustc: &'static str,
    /// Target triple.
    pub target: &'static str,
    /// Build profile.
    pub profile: &'static str,
    /// Level of optimisation, as the compiler was given it.
    pub opt_level: &'static str,
    /// Flags of the compiler beside those of the profile.
    pub rustflags: &'static str,
    /// Features of the processor that the compiler may use.
    pub target_features: &'static str,
    /// Features that change what is run.
    pub features: Vec<&'static str>,
    /// BLAKE3 of the lock file.
    pub lock_file_hash: String,
    /// BLAKE3 of the suite, where one was run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub suite_hash: Option<String>,
    /// BLAKE3 of the scenes as they were understood, in SI units.
    pub scenes_hash: String,
    /// Operating system and its version.
    pub os: String,
    /// Kernel and its version.
    pub kernel: String,
    /// Library of C, which holds the elementary functions, and its version.
    pub libc: String,
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
            tree: env!("PENETRODE_TREE"),
            rustc: env!("PENETRODE_RUSTC"),
            target: env!("PENETRODE_TARGET"),
            profile: env!("PENETRODE_PROFILE"),
            opt_level: env!("PENETRODE_OPT_LEVEL"),
            rustflags: env!("PENETRODE_RUSTFLAGS"),
            target_features: env!("PENETRODE_TARGET_FEATURES"),
            features: if cfg!(feature = "diffsol") { vec!["diffsol"] } else { Vec::new() },
            lock_file_hash: hash(LOCK_FILE),
            suite_hash: None,
            scenes_hash: hash(scenes),
            os: os(),
            kernel: kernel(),
            libc: libc(),
            cpu: cpu(),
            threads: rayon::current_num_threads(),
            floating_point: floating_point(),
            seed,
            command,
            peers,
            date: Utc::now().format("%Y-%m-%dT%H:%M:%SZ").to_string(),
        }
    }
}

/// BLAKE3 of a text or of bytes, in hexadecimal.
pub fn hash(of: impl AsRef<[u8]>) -> String {
    blake3::hash(of.as_ref()).to_hex().to_string()
}

/// Name of the operating system, where it states it.
fn os() -> String {
    let text = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="));
    name.map_or(std::env::consts::OS, |name| name.trim_matches('"')).to_owned()
}

/// Name and version of the kernel, where the system states them.
fn kernel() -> String {
    let stated = ["ostype", "osrelease"].map(|name| fs::read_to_string(format!("/proc/sys/kernel/{name}")));
    match stated {
        [Ok(name), Ok(version)] => format!("{} {}", name.trim(), version.trim()),
        _ => "not stated".to_owned(),
    }
}

/// The library of C that this process has loaded, as it names itself.
fn libc() -> String {
    /// How the text begins by which glibc names itself.
    const GLIBC: &[u8] = b"GNU C Library ";
    let kind = if cfg!(target_env = "gnu") {
        "glibc"
    } else if cfg!(target_env = "musl") {
        "musl"
    } else {
        std::env::consts::OS
    };
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let loaded = maps
        .lines()
        .filter_map(|line| line.split_whitespace().nth(5))
        .find(|path| path.contains("/libc.so") || path.contains("/libc-"));
    let bytes = loaded.and_then(|path| fs::read(path).ok()).unwrap_or_default();
    let named = bytes.windows(GLIBC.len()).position(|window| window == GLIBC).map(|at| &bytes[at..]);
    let name = named.and_then(|name| name.split(|byte| *byte == b'\n').next());
    name.map_or_else(|| kind.to_owned(), |name| String::from_utf8_lossy(name).trim_end_matches('.').to_owned())
}

/// Name of the processor, where the system states it.
fn cpu() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split_once(':'));
    model.map_or(std::env::consts::ARCH, |(_, name)| name.trim()).to_owned()
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
