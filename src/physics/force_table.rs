//! Which stages does a force become that is given as a table of depth, and which law one that is a table of velocity?
//!
//! **Over depth.** Between two rows the force is linear, `F = p + s x` with s of any sign, so each is a stage without viscosity
//! and drag. Where F falls through zero between two rows, a stage ends there: on every piece F has one sign, V is monotone, and
//! the least V² lies at an end of a piece (docs/theory.md, section 9).
//!
//! **Over velocity.** Between two rows `F = p + r V` with r of any sign. `M dV/dt = -F(V)` holds V alone, so V only falls, only
//! rises, or stays, as F says where the stage begins, and a speed at which F is zero is approached and never passed: each piece
//! is entered once, from one side ([`super::law`] makes laws of them that end at a speed).

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
    /// Depth x from the impact face (m), or velocity V (m/s).
    pub at: f64,
    /// Force F (N) there; negative drives the projectile.
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
    /// A depth, a velocity or a force is not finite.
    #[error("not finite")]
    NotFinite {
        /// Index of the row, from 0.
        row: usize,
    },
    /// A depth (m) or a velocity (m/s) is not beyond that of the row before.
    #[error("not beyond that of the row before, {}", Shown(*.before))]
    NotRising {
        /// Index of the row, from 0.
        row: usize,
        /// That of the row before.
        before: f64,
    },
    /// The force changes by more between a row and the one before than a slope can say.
    #[error("so far from the force of the row before that the slope between them is no 64-bit number")]
    TooSteep {
        /// Index of the row, from 0.
        row: usize,
    },
    /// A table of velocity does not begin at rest.
    #[error("the first velocity is {} m/s, and the force at rest is not known", Shown(*.0))]
    NotFromRest(f64),
}

/// `rows`, if they are a table.
fn checked(rows: &[Row]) -> Result<Arc<[Row]>, RowsRefused> {
    if rows.len() > ROWS_MAX {
        return Err(RowsRefused::TooMany);
    }
    let mut before = f64::NEG_INFINITY;
    for (row, Row { at, force }) in rows.iter().enumerate() {
        if !(at.is_finite() && force.is_finite()) {
            return Err(RowsRefused::NotFinite { row });
        }
        if *at <= before {
            return Err(RowsRefused::NotRising { row, before });
        }
        if row > 0 && !((force - rows[row - 1].force) / (at - before)).is_finite() {
            return Err(RowsRefused::TooSteep { row });
        }
        before = *at;
    }
    if rows.len() < 2 { Err(RowsRefused::TooFew(rows.len())) } else { Ok(rows.into()) }
}

impl ForceTable {
    /// The table of these `rows`.
    ///
    /// # Errors
    /// [`RowsRefused`]: fewer than two rows or too many, a number that is not finite, depths that do not rise.
    pub fn new(rows: &[Row]) -> Result<Self, RowsRefused> {
        checked(rows).map(Self)
    }

    /// Its rows, two at least.
    pub fn rows(&self) -> &[Row] {
        &self.0
    }

    /// Depth (m) of the first row.
    pub fn first(&self) -> f64 {
        self.0.first().map_or(f64::NAN, |row| row.at)
    }

    /// Depth (m) of the last row.
    pub fn last(&self) -> f64 {
        self.0.last().map_or(f64::NAN, |row| row.at)
    }

    /// The stages from the depth `from` (m) on, which lies among the rows, up to the last row.
    ///
    /// p and s are rounded: the force between two rows is off by about an epsilon of `|s| x`.
    ///
    /// # Example
    /// ```
    /// use penetrode::physics::force_table::{ForceTable, Row};
    ///
    /// let row = |at, force| Row { at, force };
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
        let behind = self.0.partition_point(|row| row.at <= from);
        self.0[behind.saturating_sub(1)..].windows(2).flat_map(move |rows| {
            let (a, b) = (rows[0], rows[1]);
            let [ax, af, bx, bf] = [a.at, a.force, b.at, b.force].map(S::decimal);
            // A plateau has none, exactly.
            let stiffness = if a.force == b.force { S::zero() } else { (bf - af).over(bx - ax) };
            let static_force = if stiffness.value() == 0.0 { af } else { af - stiffness * ax };
            let law = Stage { static_force, stiffness, ..Stage::free() };
            let (start, force) = if from > a.at {
                (from, (static_force + stiffness * S::from_f64(from)).value())
            } else {
                (a.at, a.force)
            };
            let balance = -static_force / stiffness;
            let falls_through = force > 0.0 && b.force < 0.0 && start < balance.value() && balance.value() < b.at;
            falls_through.then_some(law.until(balance)).into_iter().chain([law.until(bx)])
        })
    }
}

/// A force over velocity, linear between its rows and unknown behind the last.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedTable(Arc<[Row]>);

/// A piece of a [`SpeedTable`], as a projectile goes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Index of the row at its lower end.
    pub index: usize,
    /// Whether the velocity rises on it.
    pub rises: bool,
}

impl SpeedTable {
    /// The table of these `rows`, whose first velocity is zero: a projectile that comes to rest needs the force there.
    ///
    /// # Errors
    /// [`RowsRefused`]: fewer than two rows or too many, a number that is not finite, velocities that do not rise or do not begin
    /// at zero.
    pub fn new(rows: &[Row]) -> Result<Self, RowsRefused> {
        let rows = checked(rows)?;
        if rows[0].at == 0.0 { Ok(Self(rows)) } else { Err(RowsRefused::NotFromRest(rows[0].at)) }
    }

    /// Its rows, two at least.
    pub fn rows(&self) -> &[Row] {
        &self.0
    }

    /// Velocity (m/s) of the last row.
    pub fn last(&self) -> f64 {
        self.0.last().map_or(f64::NAN, |row| row.at)
    }

    /// Index of the row at the lower end of the piece that holds `v` (m/s), of two the one below; below rest it goes on as the
    /// first. `None` behind the last row.
    fn below(&self, v: f64) -> Option<usize> {
        let index = self.0.partition_point(|row| row.at < v).saturating_sub(1);
        (v <= self.last()).then(|| index.min(self.0.len() - 2))
    }

    /// The piece through which a projectile goes on from `v` (m/s); `None` where the table ends there.
    pub fn piece(&self, v: f64) -> Option<Piece> {
        let index = self.below(v)?;
        if self.force(v) >= 0.0 {
            return Some(Piece { index, rises: false });
        }
        let index = if v == self.0[index + 1].at { index + 1 } else { index };
        (index + 1 < self.0.len()).then_some(Piece { index, rises: true })
    }

    /// Force (N) at the lower end of the piece `index`, its slope r (kg/s), and the velocity (m/s) of that end.
    pub(crate) fn line<S: Scalar>(&self, index: usize) -> [S; 3] {
        let (a, b) = (self.0[index], self.0[index + 1]);
        let [av, af, bv, bf] = [a.at, a.force, b.at, b.force].map(S::decimal);
        let slope = if a.force == b.force { S::zero() } else { (bf - af).over(bv - av) };
        [af, slope, av]
    }

    /// Force (N) at velocity `v` (m/s); NaN behind the last row.
    pub fn force<S: Scalar>(&self, v: S) -> S {
        let Some(index) = self.below(v.value()) else { return S::from_f64(f64::NAN) };
        let b = self.0[index + 1];
        if v.value() == b.at && v.is_constant() {
            return S::from_f64(b.force);
        }
        let [force, slope, start] = self.line::<S>(index);
        force + slope * (v - start)
    }

    /// Slope `dF/dV` (kg/s) there.
    pub fn slope(&self, v: f64) -> f64 {
        self.below(v).map_or(f64::NAN, |index| self.line::<f64>(index)[1])
    }

    /// Bounds of the force (N) between two velocities (m/s), of which the part in the table counts.
    pub fn range(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let ends = [low, high].map(|v| self.force(v.min(self.last())));
        let inside = self.0.iter().filter(|row| row.at > low && row.at < high).map(|row| row.force);
        let bounds = (f64::INFINITY, f64::NEG_INFINITY);
        inside.chain(ends).fold(bounds, |(least, most), force| (least.min(force), most.max(force)))
    }

    /// A speed (m/s) that a projectile of velocity `v` (m/s) approaches for ever, if nothing ends its way: that at which the
    /// force is zero, with `v` itself where it is zero there. `None` where it comes to rest, or to the end of the table.
    pub fn terminal(&self, v: f64) -> Option<f64> {
        let Piece { index, rises } = self.piece(v)?;
        if self.force(v) == 0.0 {
            return Some(v);
        }
        let crossing = |i: usize| {
            let [force, slope, start] = self.line::<f64>(i);
            start - force / slope
        };
        if rises {
            let end = (index + 1..self.0.len()).find(|i| self.0[*i].force >= 0.0)?;
            return Some(crossing(end - 1).min(self.0[end].at));
        }
        let end = (1..=index).rev().find(|i| self.0[*i].force <= 0.0);
        if let Some(end) = end {
            return Some(crossing(end).max(self.0[end].at));
        }
        (self.0[0].force < 0.0).then(|| crossing(0))
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;

    fn table(rows: &[[f64; 2]]) -> Result<ForceTable, RowsRefused> {
        let rows: Vec<_> = rows.iter().map(|&[at, force]| Row { at, force }).collect();
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
            for row in table.rows().iter().filter(|row| [start, law.end].contains(&row.at)) {
                assert_eq!(law.force(row.at, 300.0), row.force, "{law:?}");
            }
            start = law.end;
        }
    }

    fn over_speed(rows: &[[f64; 2]]) -> Result<SpeedTable, RowsRefused> {
        let rows: Vec<_> = rows.iter().map(|&[at, force]| Row { at, force }).collect();
        SpeedTable::new(&rows)
    }

    #[test]
    fn a_table_of_velocity_begins_at_rest_and_holds_the_force_of_its_rows() {
        assert_eq!(over_speed(&[[1.0, 1.0], [2.0, 2.0]]), Err(RowsRefused::NotFromRest(1.0)));
        assert_eq!(over_speed(&[[-1.0, 1.0], [2.0, 2.0]]), Err(RowsRefused::NotFromRest(-1.0)));
        assert_eq!(over_speed(&[[0.0, 1e300], [1e-300, -1e300]]), Err(RowsRefused::TooSteep { row: 1 }));
        let rows = [[0.0, 3.0], [0.1, 0.7], [0.3, 0.7], [0.7, -0.1], [1.0, 5.0]];
        let table = over_speed(&rows).unwrap();
        for [v, force] in rows {
            assert_eq!(table.force(v), force);
        }
        assert!(table.force(1.0_f64.next_up()).is_nan() && table.force(-0.1) > 3.0);
        assert_eq!((table.slope(0.2), table.slope(0.3)), (0.0, 0.0));
        assert_eq!(table.range((0.05, 0.8)), (-0.1, table.force(0.05_f64).max(table.force(0.8_f64))));
    }

    #[test]
    fn a_velocity_falls_or_rises_to_the_next_row_as_the_force_says_and_no_piece_goes_on_behind_the_last() {
        let table = over_speed(&[[0.0, 1.0], [1.0, -1.0], [2.0, -1.0], [3.0, 1.0], [4.0, -2.0]]).unwrap();
        let piece = |v| table.piece(v).map(|piece| (piece.index, piece.rises));
        assert_eq!(piece(0.25), Some((0, false)));
        assert_eq!(piece(0.75), Some((0, true)));
        assert_eq!([piece(1.0), piece(2.0)], [Some((1, true)), Some((2, true))]);
        assert_eq!(piece(3.0), Some((2, false)));
        assert_eq!(piece(3.9), Some((3, true)));
        assert_eq!([piece(4.0), piece(4.1)], [None, None]);
        // What is approached: from between 0.5 and 3.33 m/s, 2.5 m/s; below, rest; above, the end of the table.
        let terminal = [0.25, 0.5, 0.75, 1.5, 2.5, 3.0, 3.3].map(|v| table.terminal(v));
        assert_eq!(terminal, [None, Some(0.5), Some(2.5), Some(2.5), Some(2.5), Some(2.5), Some(2.5)]);
        assert_eq!(table.terminal(3.5), None);
        // A zero that is only touched is passed no more than another.
        let touched = over_speed(&[[0.0, 1.0], [1.0, 0.0], [2.0, 1.0]]).unwrap();
        assert_eq!([touched.terminal(2.0), touched.terminal(0.5)], [Some(1.0), None]);
    }
}
