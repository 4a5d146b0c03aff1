//! Error bars of the finest value: those of the published rules, and the one of the headline, which covers.

use super::judge::{FEW_ROWS, Judge};
use super::judgement::ErrorBand;
use crate::studies::grid_convergence::{GridValue, eca_hoekstra, range, roache, three_grids, xing_stern};
use crate::studies::limit::{LawOfValues, envelope, is_constant};
use crate::studies::order::Class;
use crate::studies::quantity::Quantity;

/// Grids closer than this ratio are not used in the three-grid rules where others are there (Celik et al. 2008).
const RATIO_MIN: f64 = 1.3;

/// A time rounded by no more than this share of a step shows whether it is a whole number of them.
const WHOLE: f64 = 0.05;

/// Rule of a bar by scatter alone.
const SCATTER: &str = "scatter within a multiple of a power of the step";

impl Judge<'_> {
    /// The published rule for three grids, on grids as far apart as it asks for where the table has them.
    pub(super) fn add_three_grids(&mut self) {
        let grids = &self.grids;
        let apart = |from: &GridValue| grids.iter().copied().find(|grid| grid.step >= RATIO_MIN * from.step);
        let three = apart(&grids[0]).and_then(|second| Some([grids[0], second, apart(&second)?]));
        let three = three.or_else(|| <[GridValue; 3]>::try_from(grids.get(..3)?).ok());
        self.judged.three_grids = three.and_then(|three| three_grids(three).ok());
    }

    /// Adds the error bars of the finest value by the published rules, and the one for the headline: four diverging
    /// values and more have none.
    pub(super) fn add_bands(&mut self, law: Option<&LawOfValues>) {
        let finest = self.finest();
        let digits = self.printed_digits();
        let least = if self.is_at_step_ends() { finest.step } else { finest.round_off };
        let judged = &mut self.judged;
        if judged.class == Class::Diverging && self.grids.len() > 3 {
            return;
        }
        judged.least_squares = eca_hoekstra(&self.grids).ok();
        let three = judged.three_grids;
        let bands = &mut judged.error_bands;
        bands.extend(three.and_then(|three| three.uncertainty));
        let second =
            three.map_or(self.grids.get(1).copied(), |three| Some(GridValue::new(three.steps[1], three.values[1])));
        if let (Some(coarse), true) = (second, judged.class != Class::Oscillating) {
            let (observed, formal) = (three.and_then(|three| three.order), judged.formal_order);
            bands.extend(roache(finest, coarse, observed, formal));
            bands.extend(
                observed.zip(formal).and_then(|(observed, formal)| xing_stern(finest, coarse, observed, formal)),
            );
        }
        // The laws of Eça and Hoekstra end at order two.
        let is_low = judged.formal_order.or(judged.observed_order).is_none_or(|order| order < 2.5);
        bands.extend(judged.least_squares.filter(|_| is_low).and_then(|least| least.uncertainty));
        let widest = bands.iter().max_by(|a, b| a.half_width.total_cmp(&b.half_width));
        let widest = widest.map(|band| ErrorBand { half_width: band.half_width, rule: band.rule });
        judged.error_band = if is_constant(&self.grids) {
            Some(digits)
        } else if judged.class == Class::Oscillating {
            let half_width = 0.5 * range(&self.grids);
            widest
                .filter(|band| band.half_width > half_width)
                .or(Some(ErrorBand { half_width, rule: "half the range" }))
        } else if let Some(law) = law {
            let half_width = law.half_width(&finest);
            // Too few rows leave the interval wide: twice the published bar covers as well.
            let least =
                judged.least_squares.and_then(|least| least.uncertainty).filter(|_| self.grids.len() <= FEW_ROWS);
            let least =
                least.map(|bar| ErrorBand { half_width: 2.0 * bar.half_width, rule: "twice Eça and Hoekstra" });
            let rule = law.envelope.map_or("95 % interval of the limit", |_| SCATTER);
            let own = Some(ErrorBand { half_width, rule }).filter(|own| own.half_width.is_finite());
            let range = ErrorBand { half_width: range(&self.grids), rule: "the range of the values" };
            least
                .filter(|least| own.is_none_or(|own| least.half_width < own.half_width))
                .or(own)
                .or(widest)
                .or(Some(range))
        } else {
            let unconfirmed = three.filter(|three| judged.formal_order.is_none() && three.uncertainty.is_some());
            let unconfirmed = unconfirmed.map(|three| {
                // Three rows that scatter show orders as high as any: above two, two is the careful one.
                let order = three.order.map_or(1.0, |order| order.clamp(0.5, 2.0));
                let [f1, f2, _] = three.values;
                let half_width = 3.0 * (f2 - f1).abs() / (order * three.ratios[0].ln()).exp_m1();
                ErrorBand { half_width, rule: "GCI with Fs 3, for nothing confirms the order" }
            });
            let scatter =
                (self.grids.len() > 2).then(|| ErrorBand { half_width: envelope(&self.grids), rule: SCATTER });
            unconfirmed.or(widest).or(scatter)
        }
        .map(|band| ErrorBand { half_width: band.half_width.max(least), ..band });
    }

    /// Whether the values are times of whole numbers of steps: what they are seen by lies up to a step before them, and they may
    /// agree in every digit.
    fn is_at_step_ends(&self) -> bool {
        let is_whole = |grid: &GridValue| {
            let steps = grid.value / grid.step;
            let rounding = grid.round_off / grid.step + 4.0 * f64::EPSILON * steps;
            rounding < WHOLE && (steps - steps.round()).abs() <= rounding
        };
        let is_time = matches!(self.judged.quantity.quantity(), Some(Quantity::Time | Quantity::CraterEndTime));
        is_time && self.grids.iter().all(is_whole)
    }

    pub(super) fn printed_digits(&self) -> ErrorBand {
        ErrorBand { half_width: range(&self.grids) + self.rounding(), rule: "the printed digits" }
    }
}
