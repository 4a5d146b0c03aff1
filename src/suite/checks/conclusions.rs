//! What becomes of the paper's conclusions on its Figures 4 and 5. A claim holds where the program's verdict is the right
//! one, be it that the conclusion is refuted; the verdict stands in its remark.

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::edges::Violations;
use super::{Subject, off};
use crate::physics::{Parameter, Scene};
use crate::studies::sweep::{self, Axis, Conclusion, Plan, Row, Side, Standing};

check! {
    /// "A bound of measured energies": the verdict on points a millionth beside a curve that was computed elsewhere, refuted by
    /// any of them that lies on the wrong side; and not testable without points. With `--data` the remark has the verdict on
    /// those.
    BoundOfData {
        /// `lower`, Eq. 15 as printed, or `upper`, the simulation.
        side: Side,
        /// The curve, (H/d, `E_c/(d³ fc)`).
        curve: Vec<(f64, f64)>,
    } in Slab, "wrong verdicts", by bound_of_data, compares (Method Search Formulas | Elsewhere);
    /// "The difference falls with H/d": borne out up to the place of the least difference as computed elsewhere, refuted beyond
    /// and over all, and borne out without drag; whether 200 points are asked or 5000.
    GapFalls {
        /// Largest H/d.
        to: f64,
        /// H/d of the least difference, and that difference over Eq. 15.
        least: (f64, f64),
        /// The difference at the largest H/d, over Eq. 15.
        last: f64,
    } in Slab, "wrong verdicts", by gap_falls, compares (Method Search Formulas | Elsewhere);
}

/// What was counted, with the verdict on the conclusion in front.
fn concluded(seen: Violations, found: Conclusion) -> Measurement {
    let counted = seen.measurement();
    let remark = format!("{}: {}; {}", found.standing, found.reason, counted.remark);
    counted.remark(remark).evidence(Evidence::Conclusion(found))
}

fn along(scene: &Scene, from: f64, to: f64, count: usize) -> Found<Plan> {
    let axis = Axis { parameter: Parameter::ThicknessRatio, from, to, unit: None, count, logarithmic: false };
    Ok(Plan::new(scene.clone(), &[axis])?)
}

fn bound_of_data(BoundOfData { side, curve }: &BoundOfData, subject: &Subject<'_>) -> Found {
    const BESIDE: f64 = 1e-6;
    let scene = subject.scene()?;
    let method = subject.method(None)?;
    let plan = along(scene, 1.0, 1.0, 1)?;
    let beside = |points: &[(f64, f64)]| plan.beside(points, method.integrator());
    let mut seen = Violations::default();
    let mut expect = |points: &[(f64, f64)], standing: Standing, of: &dyn Fn() -> String| -> Found<()> {
        let found = sweep::bound(*side, &beside(points)?);
        seen.expect(found.standing == standing, || format!("{} {}", found.standing, of()));
        Ok(())
    };
    // Measured energies lie above a lower bound and below an upper one.
    let right = match side {
        Side::Lower => 1.0 + BESIDE,
        Side::Upper => 1.0 - BESIDE,
    };
    let on_the_right_side: Vec<_> = curve.iter().map(|(ratio, energy)| (*ratio, right * energy)).collect();
    expect(&[], Standing::NotTestable, &|| "without points".to_owned())?;
    expect(&on_the_right_side, Standing::BorneOut, &|| "by points on the right side".to_owned())?;
    for (index, (ratio, energy)) in curve.iter().enumerate() {
        let mut points = on_the_right_side.clone();
        points[index].1 = energy / right;
        expect(&points, Standing::Refuted, &|| format!("by a point on the wrong side at H/d = {ratio}"))?;
    }
    let given = sweep::bound(*side, &beside(subject.context.points)?);
    Ok(concluded(seen, given))
}

fn gap_falls(&GapFalls { to, least: (at, least), last }: &GapFalls, subject: &Subject<'_>) -> Found {
    // Behind the last joint of Eq. 15 on this side of the least.
    const FROM: f64 = 3.8;
    const DIGITS: f64 = 1e-8;
    let scene = subject.scene()?;
    let method = subject.method(None)?;
    let run = |scene: &Scene, from, to, count| -> Found<Vec<Row>> {
        let rows = along(scene, from, to, count)?.run(method.integrator());
        holds!(rows.iter().all(|row| row.error.is_empty()), "a point of the sweep has no answer");
        Ok(rows)
    };
    let mut bare = scene.clone();
    Parameter::Density.set(&mut bare, 0.0).map_err(|error| NotMeasured::skip(error.to_string()))?;
    let mut seen = Violations::default();
    let whole = run(scene, FROM, to, 200)?;
    let found = sweep::falls(&whole);
    for (what, rows, standing) in [
        ("over all", whole, Standing::Refuted),
        ("over all, in 5000 points", run(scene, FROM, to, 5000)?, Standing::Refuted),
        ("up to the least", run(scene, FROM, at, 200)?, Standing::BorneOut),
        ("beyond the least", run(scene, at, to, 200)?, Standing::Refuted),
        ("without drag", run(&bare, FROM, to, 200)?, Standing::BorneOut),
    ] {
        let standing_found = sweep::falls(&rows).standing;
        seen.expect(standing_found == standing, || format!("{standing_found} {what}"));
    }
    let ends = run(scene, at, to, 2)?;
    for (row, gap) in ends.iter().zip([least, last]) {
        let found = row.energy_full_depth.zip(row.eq15_unrounded).map_or(f64::NAN, |(over, under)| over / under - 1.0);
        seen.expect(off(found, gap) <= DIGITS, || format!("{found} at H/d = {}, not {gap}", row.values[0]));
    }
    Ok(concluded(seen, found))
}
