//! The search for the critical velocity under wrong objectives, without a root, and near its root.

use super::super::{Subject, off, worse};
use super::{Violations, slab};
use crate::integrators::{Cost, Detail, Energy, Flight, IntegrationError, Integrator, Margin};
use crate::physics::reference::{self, Source};
use crate::physics::{Outcome, Problem, Resistance, Scene, semi_empirical};
use crate::studies::critical_velocity::{self, CriticalError};
use crate::suite::claim::{Found, Measurement, NotMeasured};

check! {
    /// V1 of `verification/edges.toml`.
    Objectives {} in Critical, "violations", counting objectives, compares (Energy Search | ClosedForm);
    /// V2 of `verification/edges.toml`.
    NoRoot {} in Critical, "violations", counting no_root, compares nothing;
    /// V3 of `verification/edges.toml`.
    CriticalErrorBound {} in Critical, "error/bar", by critical_error_bound, compares (Method Search | FiftyDigits);
    /// V4 of `verification/edges.toml`.
    JumpsOfEq15 {} in Critical, "S", by jumps_of_eq15, compares (Formulas | Itself);
}

/// What a search may be given in place of the signed energy: from the margin, and the share of the target crossed.
type Objective = fn(f64, f64) -> f64;

/// The energy formulation with another objective as its margin.
#[derive(Clone, Copy, Debug)]
struct Disguised(Objective);

impl Integrator for Disguised {
    fn name(&self) -> &'static str {
        "disguised"
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        Energy::new().solve(problem, detail)
    }

    fn exit_margin(&self, problem: &Problem) -> Result<Option<Margin>, IntegrationError> {
        let flight = Energy::new().solve(problem, Detail::End)?;
        let value = self.0(flight.exit_margin.unwrap_or(f64::NAN), flight.end.depth / problem.exit_depth);
        Ok(Some(Margin { value, error: None, cost: Cost::default() }))
    }
}

fn objectives(_: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let wrong: [(&str, Objective); 3] = [
        ("SignedSpeed", |margin, _| margin.abs().sqrt().copysign(margin)),
        ("Perforated", |margin, _| 1f64.copysign(margin)),
        ("CappedDepth", |_, share| (share - 1.0).min(0.0)),
    ];
    for drag in [false, true] {
        let scene = slab(drag);
        let exact = critical_velocity::exact(&scene)?;
        let found = critical_velocity::of_scene(&scene, &Energy::new())?;
        let error = off(found.velocity, exact);
        seen.expect(error <= 1e-14 && found.evaluations <= 8, || {
            format!("off by {error:e} after {} solutions", found.evaluations)
        });
        for (name, objective) in wrong {
            match critical_velocity::of_scene(&scene, &Disguised(objective)) {
                Ok(found) => seen.expect(off(found.velocity, exact) <= 1e-9, || {
                    format!("{name} gives {} for {exact} m/s", found.velocity)
                }),
                Err(_) => seen.notes.push(format!("{name}: refused")),
            }
        }
    }
    Ok(())
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn no_root(_: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let search = |scene: &Scene| critical_velocity::of_scene(scene, &Energy::new());
    // Ten kilometres of concrete against 0.9 kg: the drag multiplies E_c by e for every 3 m, beyond 1e1000.
    let deep = search(&Scene { thickness: Some(1e4), ..slab(true) });
    let said = deep.as_ref().err().map(ToString::to_string).unwrap_or_default();
    seen.expect(matches!(deep, Err(CriticalError::NoBracket { .. } | CriticalError::Flight { .. })), || {
        format!("{deep:?}")
    });
    seen.expect(said.matches("m/s").count() >= 1, || said.clone());
    seen.notes.push(said);
    let none = search(&Scene { thickness: Some(0.0), ..slab(true) });
    seen.expect(none.as_ref().is_ok_and(|c| c.velocity == 0.0 && !c.note.is_empty()), || format!("{none:?}"));
    let open = search(&Scene { thickness: None, ..slab(true) });
    seen.expect(matches!(open, Err(CriticalError::NoExit)), || format!("{open:?}"));
    let nan = critical_velocity::of_scene(&slab(true), &Disguised(|_, _| f64::NAN));
    seen.expect(matches!(nan, Err(CriticalError::NotFinite { .. })), || format!("{nan:?}"));
    Ok(())
}

fn critical_error_bound(subject: &Subject<'_>) -> Found {
    let method = subject.method(None)?;
    let widest = if subject.method_name().needs_diffsol() { 1e-4 } else { 1e-12 };
    let mut worst = 0.0;
    for (drag, given) in [(false, false), (true, false), (true, true)] {
        let mut scene = slab(drag);
        if let (true, Resistance::Concrete(c)) = (given, &mut scene.resistance) {
            c.crater_stiffness = crate::physics::CraterStiffness::Given(1e7);
        }
        // The closed form of V_c shares its stages with the method of that name.
        let exact = reference::critical(Source::Scene(&scene, 400.0))?.velocity.to_f64();
        let found = critical_velocity::of_scene(&scene, method.integrator())?;
        let bar = found.error_bar.ok_or_else(|| NotMeasured::broken("no error bar"))?;
        holds!(bar <= widest * exact, "the error bar is {bar:e} m/s wide");
        // The exact value is itself rounded.
        let rounding = 2.0 * f64::EPSILON * exact;
        worst = worse(worst, (found.velocity - exact).abs() / (bar + rounding));
        // A margin inside its error bound at V_c itself: dV_r/dV0 is infinite there, and V_r is no measure.
        let problem = scene.resolve(exact)?;
        let flight = method.integrator().solve(&problem, Detail::End)?;
        holds!(flight.outcome == Outcome::Undecided, "{} at V_c itself", flight.outcome);
    }
    Ok(Measurement::new(worst))
}

fn jumps_of_eq15(_: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    for (jump, (at, height)) in semi_empirical::jumps().iter().zip([(3.0, 0.002_723_8), (3.8, -0.002_331_2)]) {
        holds!(jump.thickness_ratio == at, "a jump at {}", jump.thickness_ratio);
        worst = worse(worst, (jump.above - jump.below - height).abs());
    }
    Ok(Measurement::new(worst))
}
