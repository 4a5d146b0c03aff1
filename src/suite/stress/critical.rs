//! The search for the critical velocity under wrong objectives, without a root, and near its root.

use super::{ALL_ADAPTIVE, Case, Subject, Violations, critical_of, slab, worse};
use crate::integrators::{Cost, Detail, Energy, Flight, IntegrationError, Integrator, Margin, MethodName};
use crate::physics::{Outcome, Problem, Resistance, Scene, semi_empirical};
use crate::studies::critical_velocity::{self, CriticalError};
use crate::studies::extreme_scenes::exceeds;
use crate::suite::claim::{Measurement, NotMeasured};

const NONE: &[MethodName] = &[];

pub(super) const CASES: &[Case] = &[
    Case {
        id: "V1",
        statement: "the signed energy gives V_c; signed V_r, perforated or not, and depth capped at H give V_c or an error, never another number",
        reason: "zero: with the last two a root finder returns an end of its bracket and reports convergence",
        limit: 0.0,
        unit: "violations",
        methods: NONE,
        measure: objectives,
    },
    Case {
        id: "V2",
        statement: "no finite V_c, V_c = 0 and an objective that is NaN are each said, with the flights that show it",
        reason: "zero: each has its own error or note",
        limit: 0.0,
        unit: "violations",
        methods: NONE,
        measure: no_root,
    },
    Case {
        id: "V3",
        statement: "the error bar of V_c covers its error, for each method and its bar of W over dW/dV0",
        reason: "1: the exact V_c lies within the bar, and the bar is below 1e-4 (tolerance 1e-10) or 1e-12 (round-off) of V_c",
        limit: 1.0,
        unit: "error/bar",
        methods: ALL_ADAPTIVE,
        measure: bar_covers,
    },
    Case {
        id: "V4",
        statement: "Eq. 15 as printed jumps by +0.0027238 S at H/d = 3 and by -0.0023312 S at 3.8, and the program says so",
        reason: "5e-8 S: the jumps of theory section 4 have five digits",
        limit: 5e-8,
        unit: "S",
        methods: NONE,
        measure: jumps_of_eq15,
    },
];

/// What a search is given in place of the signed energy.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Objective {
    SignedEnergy,
    SignedSpeed,
    Perforated,
    CappedDepth,
    NotANumber,
}

/// The energy formulation with another objective as its margin.
#[derive(Clone, Copy, Debug)]
struct Disguised(Objective);

impl Integrator for Disguised {
    fn name(&self) -> &'static str {
        "disguised"
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        Energy::new().fly(problem, detail)
    }

    fn exit_margin(&self, problem: &Problem) -> Result<Option<Margin>, IntegrationError> {
        let flight = Energy::new().fly(problem, Detail::End)?;
        let margin = flight.exit_margin.unwrap_or(f64::NAN);
        let value = match self.0 {
            Objective::SignedEnergy => margin,
            Objective::SignedSpeed => margin.abs().sqrt().copysign(margin),
            Objective::Perforated => 1f64.copysign(margin),
            Objective::CappedDepth => (flight.end.depth / problem.exit_depth - 1.0).min(0.0),
            Objective::NotANumber => f64::NAN,
        };
        let error = (self.0 == Objective::SignedEnergy).then_some(flight.exit_margin_error).flatten();
        Ok(Some(Margin { value, error, cost: Cost::default() }))
    }
}

fn objectives(_: Subject) -> Result<Measurement, NotMeasured> {
    let mut seen = Violations::default();
    for drag in [false, true] {
        let scene = slab(drag);
        let exact = critical_of(&scene)?;
        for objective in
            [Objective::SignedEnergy, Objective::SignedSpeed, Objective::Perforated, Objective::CappedDepth]
        {
            match critical_velocity::of_scene(&scene, &Disguised(objective)) {
                Ok(found) => {
                    let off = (found.velocity / exact - 1.0).abs();
                    seen.expect(off <= 1e-9, || format!("{objective:?} gives {} for {exact} m/s", found.velocity));
                    if objective == Objective::SignedEnergy {
                        seen.expect(off <= 1e-14 && found.evaluations <= 8, || {
                            format!("off by {off:e} after {} flights", found.evaluations)
                        });
                    }
                }
                Err(error) => {
                    seen.expect(objective != Objective::SignedEnergy, || error.to_string());
                    seen.notes.push(format!("{objective:?}: refused"));
                }
            }
        }
    }
    Ok(seen.measurement())
}

#[expect(clippy::unnecessary_wraps, reason = "one signature for every case")]
fn no_root(_: Subject) -> Result<Measurement, NotMeasured> {
    let mut seen = Violations::default();
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
    let nan = critical_velocity::of_scene(&slab(true), &Disguised(Objective::NotANumber));
    seen.expect(matches!(nan, Err(CriticalError::NotFinite { .. })), || format!("{nan:?}"));
    Ok(seen.measurement())
}

fn bar_covers(subject: Subject) -> Result<Measurement, NotMeasured> {
    let method = subject.build(None)?;
    let widest = if subject.method().needs_diffsol() { 1e-4 } else { 1e-12 };
    let mut worst = 0.0;
    for (drag, given) in [(false, false), (true, false), (true, true)] {
        let mut scene = slab(drag);
        if let (true, Resistance::Concrete(c)) = (given, &mut scene.resistance) {
            c.crater_stiffness = crate::physics::CraterStiffness::Given(1e7);
        }
        let exact = critical_of(&scene)?;
        let found = critical_velocity::of_scene(&scene, method.integrator()).map_err(NotMeasured::broken)?;
        let bar = found.error_bar.ok_or_else(|| NotMeasured::broken("no error bar"))?;
        if exceeds(bar, widest * exact) {
            return Err(NotMeasured::broken(format!("the bar is {bar:e} m/s wide")));
        }
        // The exact value is itself rounded.
        let rounding = 2.0 * f64::EPSILON * exact;
        worst = worse(worst, (found.velocity - exact).abs() / (bar + rounding));
        // A margin inside the bar at V_c itself: dV_r/dV0 is infinite there, and V_r is no measure.
        let problem = scene.resolve(exact).map_err(NotMeasured::broken)?;
        let flight = method.integrator().fly(&problem, Detail::End).map_err(NotMeasured::broken)?;
        if flight.outcome != Outcome::Undecided {
            return Err(NotMeasured::broken(format!("{} at V_c itself", flight.outcome)));
        }
    }
    Ok(Measurement::new(worst))
}

fn jumps_of_eq15(_: Subject) -> Result<Measurement, NotMeasured> {
    let mut worst = 0.0;
    for (jump, (at, height)) in semi_empirical::jumps().iter().zip([(3.0, 0.002_723_8), (3.8, -0.002_331_2)]) {
        if jump.thickness_ratio != at {
            return Err(NotMeasured::broken(format!("a jump at {}", jump.thickness_ratio)));
        }
        worst = worse(worst, (jump.above - jump.below - height).abs());
    }
    Ok(Measurement::new(worst))
}
