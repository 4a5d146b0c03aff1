//! Two and three rows leave nothing to check a law by: the published criterion decides, an observed order within a tenth
//! of the formal one (Roache; Oberkampf and Roy).

use super::judge::{Judge, ORDER_NEAR};
use super::judgement::{FindingKind, ORDER_SHOWN};
use crate::studies::grid_convergence::{GridValue, ThreeGrids, local_order};
use crate::studies::order::Class;
use crate::studies::verdict::Verdict;

impl Judge<'_> {
    /// Class and verdict of two or three rows, which leave nothing to check a law by: the published criterion decides,
    /// an observed order within a tenth of the formal one.
    pub(super) fn classify_few(&mut self, scaled: Option<(f64, f64)>) {
        let Some(three) = self.judged.three_grids else {
            self.judged.rule = "two grids";
            self.advise("a third step shows an order, a fourth an interval of it".to_owned());
            let reason = "two rows show no order: the error bar rests on the formal one".to_owned();
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, reason);
        };
        self.judged.rule = three.rule;
        self.judged.class = three.behaviour.class();
        self.judged.observed_order = three.order.filter(|order| order.abs() < ORDER_SHOWN);
        self.judged.points.iter_mut().for_each(|point| point.used = true);
        self.judged.limit = three.extrapolated;
        let Some(order) = three.order else {
            self.advise("a fourth step, and more digits".to_owned());
            return self.end(Verdict::Undecided, FindingKind::OrderUnclear, "three rows show no order".to_owned());
        };
        let found = format!("three rows show the order {order:.2}");
        match self.judged.class {
            Class::Diverging => {
                self.advise("a fourth step tells values that run away from scatter".to_owned());
                let reason = format!("{found}: the three values run away while the step shrinks");
                return self.end(Verdict::Undecided, FindingKind::Diverging, reason);
            }
            Class::Oscillating => {
                self.advise("a fourth step tells an oscillation from scatter".to_owned());
                return self.end(Verdict::Undecided, FindingKind::Oscillating, "the three values alternate".to_owned());
            }
            Class::Converging => {}
            Class::AtFloor | Class::Undecided => {
                self.advise("a fourth step, and more digits".to_owned());
                return self.end(Verdict::Undecided, FindingKind::Noise, "two of three values are equal".to_owned());
            }
        }
        // Against an exact value each pair has an order of its own.
        let pair = |exact: f64, i: usize| {
            let [fine, coarse] = [three.values[i] - exact, three.values[i + 1] - exact];
            (coarse / fine).ln() / three.ratios[i].ln()
        };
        let pairs = scaled.map(|(exact, _)| [pair(exact, 0), pair(exact, 1)]);
        let near = |order: f64, formal: f64| (order - formal).abs() <= ORDER_NEAR * formal;
        let sure = self.rounded_orders(three).is_some_and(|[low, high]| high - low < 0.5);
        let passes = sure
            && match (self.judged.formal_order, pairs) {
                (Some(formal), None) => near(order, formal),
                (Some(formal), Some(pairs)) => near(pairs[0], formal) && near(order, formal),
                (None, Some([fine, coarse])) => near(fine, coarse) && near(fine, order),
                (None, None) => false,
            };
        if passes {
            self.judged.verdict = Verdict::Passed;
            self.judged.reason = found;
            return;
        }
        let why = match self.judged.formal_order {
            _ if !sure => "and the printed digits allow others",
            Some(formal) if !near(order, formal) => "which is not within a tenth of the formal one",
            _ if pairs.is_some() => "and the errors against the exact value another one",
            _ => "and leave nothing to check it by",
        };
        let advice = if sure { "a fourth step gives the order an interval" } else { "print more digits" };
        self.advise(advice.to_owned());
        self.end(Verdict::Undecided, FindingKind::OrderUnclear, format!("{found}, {why}"));
    }

    /// The orders of three grids that the rounding of their values allows.
    fn rounded_orders(&self, three: ThreeGrids) -> Option<[f64; 2]> {
        let [f1, f2, f3] = three.values;
        let rounding = self.rounding();
        let order = |sign: f64| {
            let moved = [f1 + sign * rounding, f2 - sign * rounding, f3 + sign * rounding];
            let grids: Vec<GridValue> =
                moved.iter().zip(three.steps).map(|(value, step)| GridValue::new(step, *value)).collect();
            local_order(&grids)
        };
        let (a, b) = (order(1.0)?, order(-1.0)?);
        Some([a.min(b), a.max(b)])
    }
}
