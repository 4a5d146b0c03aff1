//! The vector instructions that the processor has, for loops over lanes. Results are the same bits with each.

/// What the processor offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Instructions(Kind);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// What every processor of this architecture has.
    Baseline,
    /// 256-bit vectors (x86-64).
    Avx2,
    /// 512-bit vectors (x86-64).
    Avx512,
}

/// A loop over lanes, which the compiler turns into vector instructions where [`Work::run`] is inlined always.
pub(super) trait Work {
    fn run(&mut self);
}

impl Instructions {
    /// The widest that this processor has.
    pub(super) fn detect() -> Self {
        Self::available().last().unwrap_or(Self(Kind::Baseline))
    }

    /// Those that this processor has, narrow to wide.
    pub(super) fn available() -> impl Iterator<Item = Self> {
        [Kind::Baseline, Kind::Avx2, Kind::Avx512].into_iter().filter(|kind| kind.is_available()).map(Self)
    }

    /// Runs `work` with them.
    pub(super) fn run(self, work: &mut impl Work) {
        match self.0 {
            Kind::Baseline => work.run(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the one thing that a function with `target_feature` asks for is a processor that has its features.
            // The field is private to this file, and here only `available` sets it, which asks the
            // processor for every feature that the function names, and no processor loses one.
            // The argument is a reference and the function returns nothing, so no vector crosses a border between calling
            // conventions. The function itself is safe code. CONTRIBUTING.md, "Tests", has the command that runs it
            // under a sanitizer.
            Kind::Avx512 => unsafe { with_avx512(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above, for `Kind::Avx2`.
            Kind::Avx2 => unsafe { with_avx2(work) },
            #[cfg(not(target_arch = "x86_64"))]
            _ => work.run(),
        }
    }
}

impl Kind {
    fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn with_avx512(work: &mut impl Work) {
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(work: &mut impl Work) {
    work.run();
}
