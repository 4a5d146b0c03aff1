//! The rule of Gauss and Legendre with 24 nodes on (0, 1), and the polynomial through its nodes.

use std::sync::LazyLock;

/// Nodes of the rule.
pub(super) const NODES: usize = 24;

/// The upper half of the places in (-1, 1), and their weights. Source: Abramowitz, Stegun (1964), table 25.4; digits by Newton's method.
const UPPER: [(f64, f64); NODES / 2] = [
    (0.064_056_892_862_605_63, 0.127_938_195_346_752_16),
    (0.191_118_867_473_616_3, 0.125_837_456_346_828_3),
    (0.315_042_679_696_163_4, 0.121_670_472_927_803_39),
    (0.433_793_507_626_045_1, 0.115_505_668_053_725_6),
    (0.545_421_471_388_839_6, 0.107_444_270_115_965_63),
    (0.648_093_651_936_975_5, 0.097_618_652_104_113_88),
    (0.740_124_191_578_554_4, 0.086_190_161_531_953_27),
    (0.820_001_985_973_903, 0.073_346_481_411_080_3),
    (0.886_415_527_004_401_1, 0.059_298_584_915_436_78),
    (0.938_274_552_002_732_8, 0.044_277_438_817_419_81),
    (0.974_728_555_971_309_5, 0.028_531_388_628_933_663),
    (0.995_187_219_997_021_3, 0.012_341_229_799_987_2),
];

/// Nodes in order, their weights in an integral, and those in the barycentric formula.
pub(super) struct Rule {
    pub(super) nodes: [f64; NODES],
    pub(super) weights: [f64; NODES],
    barycentric: [f64; NODES],
}

pub(super) static GAUSS: LazyLock<Rule> = LazyLock::new(|| {
    let mut pairs: Vec<_> =
        UPPER.iter().flat_map(|(z, w)| [(0.5 - 0.5 * z, 0.5 * w), (0.5 + 0.5 * z, 0.5 * w)]).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (nodes, weights) = (std::array::from_fn(|i| pairs[i].0), std::array::from_fn(|i| pairs[i].1));
    // For the nodes of Gauss they are (-1)^i sqrt((1 - z²) w).
    let barycentric = |i: usize| {
        let (node, weight) = pairs[i];
        let size = (node * (1.0 - node) * weight).sqrt();
        if i.is_multiple_of(2) { size } else { -size }
    };
    Rule { nodes, weights, barycentric: std::array::from_fn(barycentric) }
});

impl Rule {
    /// What the value at each node weighs in the polynomial `at` a place: the second barycentric formula.
    pub(super) fn at(&self, at: f64) -> [f64; NODES] {
        if let Some(node) = self.nodes.iter().position(|node| *node == at) {
            return std::array::from_fn(|i| f64::from(u8::from(i == node)));
        }
        let parts: [f64; NODES] = std::array::from_fn(|i| self.barycentric[i] / (at - self.nodes[i]));
        let sum: f64 = parts.iter().sum();
        parts.map(|part| part / sum)
    }
}

#[cfg(test)]
mod tests {
    use super::{GAUSS, NODES};

    #[test]
    fn the_rule_is_exact_for_degree_47_and_its_polynomial_for_degree_23() {
        for degree in 0..2 * NODES as i32 {
            let integral: f64 = GAUSS.nodes.iter().zip(GAUSS.weights).map(|(u, w)| w * u.powi(degree)).sum();
            assert!((integral * f64::from(degree + 1) - 1.0).abs() < 1e-14, "{degree}: {integral}");
        }
        for at in [0.0, 0.3, GAUSS.nodes[7], 0.999, 1.0] {
            let weights = GAUSS.at(at);
            let value: f64 = GAUSS.nodes.iter().zip(weights).map(|(u, w)| w * (2.0 * u - 1.0).powi(23)).sum();
            assert!((value - (2.0 * at - 1.0_f64).powi(23)).abs() < 1e-14, "{at}: {value}");
        }
    }
}
