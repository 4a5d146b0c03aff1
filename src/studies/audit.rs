//! Do step-size results of another code converge, how fast, and to what?
//!
//! A table of `dt_s` and results comes in ([`Table::read`]), a verdict comes out ([`audit`]): order with interval,
//! class, error bars by named rules, and agreement with the exact values where they are known.
//!
//! A table that cannot be judged is an [`AuditError`] with file, line and column (exit code 2). NaN, divergence,
//! oscillation, a missed order, a wrong limit and a quantity that the scene does not have fail (3); constants that the
//! scene does not fix, zero errors and noise leave it undecided (4). Rows out of order and repeated rows are put right
//! and mentioned.

mod bars;
mod column;
mod few_rows;
mod judge;
mod judgement;
mod run;
mod table;

use thiserror::Error;

use super::scheme_of_table::Identification;
use super::verdict::Verdict;
use crate::exchange::tables::TableError;
use crate::physics::{Advice, Shown};
pub use column::{Column, RESULTS};
use judge::Judge;
pub use judgement::{
    Audit, AuditPoint, ErrorBand, Exact, ExactValues, Finding, FindingKind, Finest, FormalOrders, QuantityAudit,
};
pub use run::{Axis, Reading, Run, RunError};
pub(crate) use table::FlightRow;
pub use table::{ROWS_MAX, Table};

/// Two-sided level of the intervals behind a verdict on one table.
///
/// Coarser than that of a suite, which judges a hundred fits of sixty points at once: four rows leave one degree of
/// freedom, and at 10⁻⁶ nothing could be said of them.
pub const AUDIT_LEVEL: f64 = 1e-3;

/// Fewest different steps, of a table with a formal order for every column and of others.
const STEPS_WITH_ORDER: usize = 2;
const STEPS_MIN: usize = 3;

/// Least order to compare with: below it halving the step moves the error by less than 7 %.
pub const ORDER_MIN: f64 = 0.1;

/// Largest order to compare with: beyond it four steps do not fit between an error of one and round-off.
pub const ORDER_MAX: f64 = 32.0;

/// Why a table cannot be judged (exit code 2).
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AuditError {
    /// A fault of the table itself.
    #[error(transparent)]
    Table(#[from] Box<TableError>),
    /// A run of another code that gives no row: its file, and why.
    #[error("{0}: {1}")]
    Run(String, RunError),
    /// An order to compare with that no study of step sizes can show.
    #[error("the order {} is not allowed: a number from {ORDER_MIN} to {ORDER_MAX}", Shown(*.0))]
    BadOrder(f64),
    /// An order for a column that is not there.
    #[error("an order is given for `{name}`, and the columns are {columns}")]
    NoColumn {
        /// Name given.
        name: String,
        /// Names of the columns.
        columns: String,
    },
}

impl Advice for AuditError {
    fn help(&self) -> String {
        match self {
            Self::Table(error) => error.help(),
            Self::Run(_, error) => error.help(),
            Self::NoColumn { .. } => "name a column of the table, or give one order for all".to_owned(),
            Self::BadOrder(_) => "give the formal order of the other code's scheme, such as 1 or 2".to_owned(),
        }
    }
}

/// Judges a table, by the formal `orders` of the other scheme and the exact solution where it is known.
///
/// Order and limit are fitted to the values ([`super::limit`]); against an exact value the order is fitted to the errors
/// ([`super::order`]), and the limit must agree. Where a known scheme reproduces every row, its orders are expected, and
/// the column passes. Three rows are judged by the published rules for three grids, two with a
/// formal order have an error bar.
///
/// # Errors
/// [`AuditError::BadOrder`] for an expected order outside [`ORDER_MIN`] to [`ORDER_MAX`], [`AuditError::NoColumn`] for one
/// of a column that is not there, [`AuditError::Table`] for two steps without an order.
pub fn audit(
    table: &Table,
    orders: &FormalOrders,
    exact: Option<&ExactValues>,
    scheme: Option<Identification>,
) -> Result<Audit, AuditError> {
    let given = orders.all.iter().chain(orders.single.iter().map(|(_, order)| order));
    if let Some(order) = given.copied().find(|order| !(ORDER_MIN..=ORDER_MAX).contains(order)) {
        return Err(AuditError::BadOrder(order));
    }
    let names: Vec<&str> = table.columns.iter().map(|column| column.column.name()).collect();
    let is_there = |name: &str| names.contains(&name) || table.columns.iter().any(|c| c.column.with_unit() == name);
    if let Some((name, _)) = orders.single.iter().find(|(name, _)| !is_there(name)) {
        return Err(AuditError::NoColumn { name: name.clone(), columns: names.join(", ") });
    }
    table.holds_steps(if given_for_all(table, orders) { STEPS_WITH_ORDER } else { STEPS_MIN })?;
    let mut findings = table.findings.clone();
    let judged = table.columns.iter().map(|column| {
        Judge::new(table, column, orders.of(&column.column), exact).of_scheme(scheme.as_ref()).decide(&mut findings)
    });
    let quantities: Vec<QuantityAudit> = judged.collect();
    // A table always has a column.
    let verdict = quantities.iter().map(|column| column.verdict).max().unwrap_or(Verdict::Undecided);
    Ok(Audit { schema: "penetrode/audit/1", verdict, findings, quantities, scheme })
}

/// Whether every column has a formal order.
fn given_for_all(table: &Table, orders: &FormalOrders) -> bool {
    table.columns.iter().all(|column| orders.of(&column.column).is_some())
}

#[cfg(test)]
mod tests;
