//! Manufactured solutions.

use super::super::claim::{Claim, ManufacturedPath, Measurement, NotMeasured};
use super::Context;

pub(super) fn order(
    _claim: &Claim,
    _context: Context<'_>,
    _path: ManufacturedPath,
    _order: f64,
) -> Result<Measurement, NotMeasured> {
    Err(NotMeasured::broken("not yet"))
}
