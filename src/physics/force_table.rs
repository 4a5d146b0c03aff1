//! Which stages does a force become that is given as a table of depth?
//!
//! Between two rows the force is linear, `F = p + s x` with s of any sign, so each is a stage without viscosity and drag.
//! Where F falls through zero between two rows, a stage ends there: on every piece F has one sign, V is monotone, and the
//! least V² lies at an end of a piece (docs/theory.md, section 9).

use std::sync::Arc;

use thiserror::Error;

use super::problem::Stage;
use super::scalar::Scalar;
use crate::text::Shown;

/// Most rows of a table. Each is a stage or two, of which every method solves some thousands in milliseconds.
pub const ROWS_MAX: usize = 20_000;

/// A row of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Depth x from the impact face (m).
    pub depth: f64,
    /// Force F (N); negative drives the projectile.
    pub force: f64,
}

/// A force over depth, linear between its rows and unknown outside of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceTable(Arc<[Row]>);

/// Why rows are no table of a force.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RowsRefused {
    /// Fewer than two rows say nothing of a force between them.
    #[error("a table of a force needs two rows, and this one has {0}")]
    TooFew(usize),
    /// More than [`ROWS_MAX`].
    #[error("more than {ROWS_MAX} rows")]
    TooMany,
    /// A depth or a force is not finite.
    #[error("not finite")]
    NotFinite {
        /// Index of the row, from 0.
        row: usize,
    },
    /// A depth is not beyond that of the row before.
    #[error("not beyond the depth of the row before, {} m", Shown(*.before))]
    NotRising {
        /// Index of the row, from 0.
        row: usize,
        /// Depth of the row before (m).
        before: f64,
    },
}

impl ForceTable {
    /// The table of these `rows`.
    ///
    /// # Errors
    /// [`RowsRefused`]: fewer than two rows or too many, a number that is not finite, depths that do not rise.
    pub fn new(rows: &[Row]) -> Result<Self, RowsRefused> {
        if rows.len() > ROWS_MAX {
            return Err(RowsRefused::TooMany);
        }
        let mut before = f64::NEG_INFINITY;
        for (row, Row { depth, force }) in rows.iter().enumerate() {
            if !(depth.is_finite() && force.is_finite()) {
                return Err(RowsRefused::NotFinite { row });
            }
            if *depth <= before {
                return Err(RowsRefused::NotRising { row, before });
            }
            before = *depth;
        }
        if rows.len() < 2 { Err(RowsRefused::TooFew(rows.len())) } else { Ok(Self(rows.into())) }
    }

    /// Its rows, two at least.
    pub fn rows(&self) -> &[Row] {
        &self.0
    }

    /// Depth (m) of the first row.
    pub fn first(&self) -> f64 {
        self.0.first().map_or(f64::NAN, |row| row.depth)
    }

    /// Depth (m) of the last row.
    pub fn last(&self) -> f64 {
        self.0.last().map_or(f64::NAN, |row| row.depth)
    }

    /// The stages from the depth `from` (m) on, which lies among the rows, up to the last row.
    ///
    /// p and s are rounded: the force between two rows is off by about an epsilon of `|s| x`.
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::force_table::{ForceTable, Row};
    ///
    /// let row = |depth, force| Row { depth, force };
    /// let table = ForceTable::new(&[row(0.0, 0.0), row(1.0, 30.0), row(3.0, -10.0)])?;
    /// // 30 N/m up, and 20 N/m down through zero at 2.5 m.
    /// let stages: Vec<_> = table.stages(0.0).map(|s| (s.static_force, s.stiffness, s.end)).collect();
    /// assert_eq!(stages, [(0.0, 30.0, 1.0), (50.0, -20.0, 2.5), (50.0, -20.0, 3.0)]);
    /// # Ok::<(), penetrode::physics::force_table::RowsRefused>(())
    /// ```
    pub fn stages(&self, from: f64) -> impl Iterator<Item = Stage> {
        self.stages_in(from)
    }

    /// As [`ForceTable::stages`], in any number type.
    pub(crate) fn stages_in<S: Scalar>(&self, from: f64) -> impl Iterator<Item = Stage<S>> {
        let behind = self.0.partition_point(|row| row.depth <= from);
        self.0[behind.saturating_sub(1)..].windows(2).flat_map(move |rows| {
            let (a, b) = (rows[0], rows[1]);
            let [ax, af, bx, bf] = [a.depth, a.force, b.depth, b.force].map(S::decimal);
            // A plateau has none, exactly.
            let stiffness = if a.force == b.force { S::zero() } else { (bf - af).over(bx - ax) };
            let static_force = if stiffness.value() == 0.0 { af } else { af - stiffness * ax };
            let law = Stage { static_force, stiffness, ..Stage::free() };
            let (start, force) = if from > a.depth {
                (from, (static_force + stiffness * S::from_f64(from)).value())
            } else {
                (a.depth, a.force)
            };
            let balance = -static_force / stiffness;
            let falls_through = force > 0.0 && b.force < 0.0 && start < balance.value() && balance.value() < b.depth;
            falls_through.then_some(law.until(balance)).into_iter().chain([law.until(bx)])
        })
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    fn table(rows: &[[f64; 2]]) -> Result<ForceTable, RowsRefused> {
        let rows: Vec<_> = rows.iter().map(|&[depth, force]| Row { depth, force }).collect();
        ForceTable::new(&rows)
    }

    #[test]
    fn rows_that_are_no_table_are_refused_with_their_index() {
        assert_eq!(table(&[]), Err(RowsRefused::TooFew(0)));
        assert_eq!(table(&[[0.0, 1.0]]), Err(RowsRefused::TooFew(1)));
        assert_eq!(table(&[[0.0, 1.0], [0.0, 2.0]]), Err(RowsRefused::NotRising { row: 1, before: 0.0 }));
        assert_eq!(table(&[[0.0, 1.0], [-1.0, 2.0]]), Err(RowsRefused::NotRising { row: 1, before: 0.0 }));
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(table(&[[0.0, 1.0], [1.0, bad]]), Err(RowsRefused::NotFinite { row: 1 }));
            assert_eq!(table(&[[bad, 1.0], [1.0, 1.0]]), Err(RowsRefused::NotFinite { row: 0 }));
        }
        let many: Vec<_> = (0..=ROWS_MAX).map(|depth| [depth as f64, 1.0]).collect();
        assert_eq!(table(&many), Err(RowsRefused::TooMany));
        assert!(table(&many[1..]).is_ok());
    }

    #[test]
    fn pieces_hold_the_force_of_the_rows_keep_its_sign_and_begin_where_they_are_asked_for() {
        let table = table(&[[-1.0, -4.0], [1.0, 4.0], [2.0, 4.0], [4.0, -4.0], [5.0, 0.0], [6.0, -1.0]]).unwrap();
        let ends = |from: f64| table.stages(from).map(|law| law.end).collect::<Vec<_>>();
        assert_eq!(ends(-1.0), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(ends(0.5), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        // At a row the next piece begins, and behind the balance nothing is split.
        assert_eq!(ends(2.0), [3.0, 4.0, 5.0, 6.0]);
        assert_eq!(ends(3.0), [4.0, 5.0, 6.0]);
        assert_eq!((table.first(), table.last()), (-1.0, 6.0));
        let mut start = -1.0;
        for law in table.stages(-1.0) {
            let forces = [start, law.end].map(|depth| law.force(depth, 0.0));
            let falls_through = forces[0] > 0.0 && forces[1] < 0.0;
            assert!(!falls_through && law.viscosity == 0.0 && law.drag == 0.0, "{law:?}");
            for row in table.rows().iter().filter(|row| [start, law.end].contains(&row.depth)) {
                assert_eq!(law.force(row.depth, 300.0), row.force, "{law:?}");
            }
            start = law.end;
        }
    }
}
