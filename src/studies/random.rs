//! Random numbers of the studies: from a seed, the same on every machine.

/// A source of random numbers; the same seed gives the same numbers.
#[derive(Clone, Debug)]
pub struct Random(fastrand::Rng);

impl Random {
    /// The source with `seed`.
    pub fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// A source for the part `name` of a study: the numbers of a part do not change when others come or go.
    pub fn for_part(seed: u64, name: &str) -> Self {
        let hash = blake3::hash(name.as_bytes());
        let mut word = [0; 8];
        word.copy_from_slice(&hash.as_bytes()[..8]);
        Self::new(seed ^ u64::from_le_bytes(word))
    }

    /// Uniform in `0 <= u < 1`.
    pub fn unit(&mut self) -> f64 {
        self.0.f64()
    }

    /// Uniform between `low` and `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Log-uniform between `low` and `high`, both above zero: never a dyadic ratio.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        (low.ln() + (high.ln() - low.ln()) * self.unit()).exp()
    }

    /// True with chance `chance`.
    pub fn chance(&mut self, chance: f64) -> bool {
        self.unit() < chance
    }

    /// An index below `count`, which is above zero.
    pub fn below(&mut self, count: usize) -> usize {
        self.0.usize(..count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_and_a_part_fix_the_numbers() {
        let draw = |seed, part| Random::for_part(seed, part).unit();
        assert_eq!(draw(7, "order"), draw(7, "order"));
        assert_ne!(draw(7, "order"), draw(7, "events"));
        assert_ne!(draw(7, "order"), draw(8, "order"));
    }

    #[test]
    fn log_uniform_stays_in_its_range() {
        let mut random = Random::new(1);
        for _ in 0..1000 {
            let value = random.log_uniform(1e-5, 1e-2);
            assert!((1e-5..=1e-2 * (1.0 + 1e-12)).contains(&value), "{value}");
        }
    }
}
