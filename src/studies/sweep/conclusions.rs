//! Do the paper's conclusions on its Figures 4 and 5 hold for this sweep, and for measured energies where there are any?

use serde::{Deserialize, Serialize};

use super::Row;
use crate::physics::semi_empirical::NDRC_FIRST_BRANCH_END;
use crate::text::count;

/// What becomes of a conclusion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, strum::Display)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "lowercase")]
pub enum Standing {
    /// The numbers say so.
    #[strum(serialize = "borne out")]
    BorneOut,
    /// The numbers say otherwise.
    Refuted,
    /// There is nothing to test it with.
    #[strum(serialize = "not testable")]
    NotTestable,
}

/// A conclusion of the paper and what becomes of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Conclusion {
    /// What the paper concludes.
    pub statement: &'static str,
    /// Whether it holds here.
    pub standing: Standing,
    /// By which numbers, or why it cannot be tested.
    pub reason: String,
}

/// A measured energy and the curves there, all as `E_c/(d³ fc)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct MeasuredPoint {
    /// H/d.
    #[serde(rename = "H_over_d")]
    pub thickness_ratio: f64,
    /// The measured energy.
    pub measured: f64,
    /// Simulation by x = H.
    pub energy_full_depth: Option<f64>,
    /// Simulation by x = `x_p(H)`.
    pub energy_ndrc: Option<f64>,
    /// Eq. 15 as printed.
    pub eq15_printed: Option<f64>,
}

/// Why measured energies are missing.
const NO_DATA: &str = "the measured energies of Bainbridge (1988), which the paper compares with, are in no public source; \
                       --data takes others";

/// A rise of the difference, relative, that roundings and the joints of Eq. 15 might make.
const RISE: f64 = 1e-3;

/// The paper's three conclusions on its Figures 4 and 5, for the `rows` of a sweep along H/d and the `points` measured.
pub fn conclusions(rows: &[Row], points: &[MeasuredPoint]) -> Vec<Conclusion> {
    vec![bound(Side::Lower, points), bound(Side::Upper, points), falls(rows)]
}

/// On which side of measured energies the paper has a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Eq. 15 as printed, below them.
    Lower,
    /// The simulation, perforation at x = H, above them.
    Upper,
}

/// "A bound of measured energies": refuted by one point on the wrong side.
pub fn bound(side: Side, points: &[MeasuredPoint]) -> Conclusion {
    // How far a point lies on the wrong side, relative to the energy measured.
    let beyond = |point: &MeasuredPoint| {
        let over = |curve: Option<f64>| Some(curve? / point.measured - 1.0);
        let off = match side {
            Side::Lower => over(point.eq15_printed)?,
            Side::Upper => -over(point.energy_full_depth)?,
        };
        Some((off, point.thickness_ratio))
    };
    let compared: Vec<_> = points.iter().filter_map(beyond).collect();
    let (standing, reason) = match compared.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)) {
        None => (Standing::NotTestable, NO_DATA.to_owned()),
        Some((off, ratio)) if off > 0.0 => (
            Standing::Refuted,
            format!("{:.1} % on the wrong side of a measured energy, at H/d = {ratio:.4}", 100.0 * off),
        ),
        Some(_) => (Standing::BorneOut, format!("by all of {}", count(compared.len(), "measured point"))),
    };
    let statement = match side {
        Side::Lower => "Eq. 15 is a lower bound of measured energies",
        Side::Upper => "the simulation is an upper bound of measured energies",
    };
    Conclusion { statement, standing, reason }
}

/// "The difference falls with H/d": from H/d = 3 on, where the paper says "especially", the simulation over unrounded Eq. 15 in
/// percent. A rise of less than a thousandth above the least so far is none.
pub fn falls(rows: &[Row]) -> Conclusion {
    let statement = "the difference between simulation and Eq. 15 falls with H/d, from 3 on";
    let gap = |row: &Row| {
        let ratio = row.thickness_ratio.filter(|ratio| *ratio > NDRC_FIRST_BRANCH_END)?;
        Some((ratio, 100.0 * (row.energy_full_depth? / row.eq15_unrounded? - 1.0)))
    };
    let gaps: Vec<(f64, f64)> = rows.iter().filter_map(gap).collect();
    let least = gaps.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
    let (Some(first), Some(last), Some(least), true) = (gaps.first(), gaps.last(), least, gaps.len() > 2) else {
        let reason = "the sweep has no three points beyond H/d = 3".to_owned();
        return Conclusion { statement, standing: Standing::NotTestable, reason };
    };
    let at = |(ratio, gap): (f64, f64)| format!("{gap:+.1} % at H/d = {ratio:.4}");
    let mut low = f64::INFINITY;
    let rises = gaps.iter().any(|(_, gap)| {
        low = low.min(*gap);
        *gap > low * (1.0 + RISE)
    });
    if rises {
        let reason = format!("it is least {}, and {}", at(least), at(*last));
        Conclusion { statement, standing: Standing::Refuted, reason }
    } else {
        let reason = format!("{}, {}", at(*first), at(*last));
        Conclusion { statement, standing: Standing::BorneOut, reason }
    }
}
