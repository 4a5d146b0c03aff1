//! The symbols of the reports: what each means, in which unit, and what defines it.

use super::page::{Table, cell};
use super::typeset;

/// A symbol, its meaning, its unit (empty for a number without one), and what defines it.
type Entry = [&'static str; 4];

/// Every symbol that a report uses, in the order in which a reader meets them.
pub(super) const SYMBOLS: [Entry; 36] = [
    ["t, x, V", "time from impact, depth below the impact face, velocity", "s, m, m/s", "x(0) = 0, V(0) = V₀"],
    ["M, d", "mass and shank diameter of the projectile", "kg, m", "scene"],
    ["V₀", "impact speed", "m/s", "scene"],
    ["H", "thickness of the target", "m", "scene"],
    ["k", "depth of the crater in diameters", "", "scene; 2 by default"],
    ["F", "resisting force", "N", "Eq. 4-5"],
    ["c", "stiffness of the crater", "N/m", "Eq. 4; continuous force at x = k d unless given"],
    ["P, Q", "static force and drag coefficient of the tunnel", "N, kg/m", "Eq. 5"],
    ["p, s, r, q", "coefficients of a stage", "N, N/m, kg/s, kg/m", "F = p + s x + r V + q V²"],
    ["f_c, ρ", "unconfined compressive strength and density of the target", "Pa, kg/m³", "scene"],
    ["S", "factor of the static strength", "", "Eq. 14"],
    ["N*", "nose factor", "", "shape of the nose; 1 for a flat one"],
    ["B", "factor of the inertia of the target", "", "scene; 1 by default"],
    ["I", "impact function", "", "M V₀²/(S f_c d³)"],
    ["N", "geometry function", "", "M/(N* B ρ d³); Eq. 13 has N* = 1"],
    ["X, T", "depth and time of rest", "m, s", "V = 0"],
    ["V_r", "residual velocity", "m/s", "V at the exit depth"],
    ["V_c", "critical velocity: the least impact speed that perforates", "m/s", "V = 0 at the exit depth"],
    ["E_c", "critical impact energy", "J", "M V_c²/2"],
    ["x_p", "depth from which the rest of a slab fails", "m", "ACE/NDRC relation, for H/d"],
    ["W", "V² at the exit, continued below zero for a stop: the exit margin is W/V₀²", "m²/s²", "energy over depth"],
    ["Δt", "step of a fixed-step scheme", "s", "Eq. 6-8"],
    ["ω", "frequency of the motion in the crater", "1/s", "√(c/M)"],
    ["rtol", "relative tolerance of a method that chooses its steps", "", "`--rtol`"],
    [
        "order",
        "slope of the error over the step, both logarithmic; formal: by theory, observed: by a fit",
        "",
        "least squares",
    ],
    ["GCI", "grid convergence index: factor of safety times the estimated error", "", "Roache"],
    ["ulp", "unit in the last place: spacing of the f64 about a value", "", "2^-52 of it at most"],
    [
        "conditioning",
        "relative change of an answer over that of the input, 1 at least",
        "",
        "derivatives of the closed form",
    ],
    ["limit", "largest measured value with which a claim passes", "as measured", "suite"],
    ["E", "comparison error: simulation less measurement (S − D of ASME V&V 20)", "m", "prediction − data"],
    ["u_num", "numerical uncertainty", "m", "ASME V&V 20"],
    ["u_input", "uncertainty from the inputs", "m", "ASME V&V 20"],
    ["u_D", "uncertainty of the data", "m", "ASME V&V 20"],
    ["u_val", "validation uncertainty", "m", "√(u_num² + u_input² + u_D²)"],
    [
        "median, spread",
        "of predicted over measured depth in a set of tests",
        "",
        "spread: standard deviation about the mean",
    ],
    ["BLAKE3", "hash by which a file is recognised", "", "256 bits"],
];

/// The table of them.
pub(super) fn table() -> Table {
    Table::cards(
        "Symbols and words, equations by the numbers of the paper",
        ["symbol", "meaning", "unit", "defined by"],
    )
    .id("table-symbols")
    .rows(SYMBOLS, |[symbol, meaning, unit, defined]| {
        [
            typeset::html(symbol),
            typeset::html(meaning),
            cell(if unit.is_empty() { "—" } else { unit }),
            typeset::html(defined),
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_symbol_stands_once_and_is_explained() {
        let mut known: Vec<&str> = Vec::new();
        for [symbols, meaning, _, defined] in SYMBOLS {
            assert!(!meaning.is_empty() && !defined.is_empty(), "{symbols}");
            for symbol in symbols.split(", ") {
                assert!(!known.contains(&symbol), "{symbol}");
                known.push(symbol);
            }
        }
    }

    /// What the typesetter puts below the line is a symbol that the table explains.
    #[test]
    fn every_set_symbol_is_in_the_table() {
        let known: Vec<&str> = SYMBOLS.iter().flat_map(|[symbols, ..]| symbols.split(", ")).collect();
        for symbol in typeset::SYMBOLS {
            assert!(known.contains(&symbol), "{symbol}");
        }
    }
}
