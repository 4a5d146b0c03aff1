//! Does everything hold at the edges? Stress cases for events, step sizes, number range and the critical velocity.
//!
//! A case is a measurement with a limit and the reason for the limit, once for every method that it applies to
//! (`E1/taylor`). Cases are code and not data like the claims of the suite: each flies scenes that no scene file should
//! hold. Numbers are those of the project's list of stress cases: E events, S steps and range, V critical velocity.
//!
//! [`crate::studies::extreme_scenes`] does the same for random scenes by the million.

mod critical;
mod events;
mod steps;

use std::time::Instant;

use rayon::prelude::*;
use twofloat::TwoFloat;

use super::claim::{Evidence, Measurement, NotMeasured};
use super::verdict::{Counts, Verdict};
use crate::integrators::method::{Method, MethodName, MethodOptions, RTOL_DEFAULT};
use crate::integrators::{Detail, Energy, Flight, Taylor};
use crate::physics::{Concrete, CraterStiffness, Outcome, Problem, Scene, Stage, Stages, Target};

/// Adaptive methods and exact solutions: what can be asked for the right outcome.
const ALL_EXACT: &[MethodName] = &[
    MethodName::Taylor,
    MethodName::Energy,
    MethodName::ClosedForm,
    MethodName::Tsit45,
    MethodName::Bdf,
    MethodName::Esdirk34,
    MethodName::TrBdf2,
    MethodName::Adaptive,
];

/// Those that integrate.
const ALL_ADAPTIVE: &[MethodName] = &[
    MethodName::Taylor,
    MethodName::Energy,
    MethodName::Tsit45,
    MethodName::Bdf,
    MethodName::Esdirk34,
    MethodName::TrBdf2,
    MethodName::Adaptive,
];

/// Those for a stage with viscosity.
const VISCOUS_AND_EXACT: &[MethodName] = &[
    MethodName::Taylor,
    MethodName::Tsit45,
    MethodName::Bdf,
    MethodName::Esdirk34,
    MethodName::TrBdf2,
    MethodName::Adaptive,
    MethodName::ClosedForm,
];

/// Those of them that integrate.
const VISCOUS: &[MethodName] = VISCOUS_AND_EXACT.split_at(6).0;

/// A case before it is run.
pub struct Case {
    /// Name: letter and number.
    pub id: &'static str,
    /// What is expected.
    pub statement: &'static str,
    /// Why this limit.
    pub reason: &'static str,
    /// Largest admissible measured value.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Methods that it applies to; empty where it has no method.
    pub methods: &'static [MethodName],
    /// How it is measured.
    measure: fn(Subject) -> Result<Measurement, NotMeasured>,
}

/// A case and what became of it, for one method.
#[derive(Clone, Debug)]
pub struct JudgedCase {
    /// Name, with the method's: `E1/taylor`.
    pub id: String,
    /// What is expected.
    pub statement: &'static str,
    /// Method, where it has one.
    pub method: Option<MethodName>,
    /// What became of it.
    pub verdict: Verdict,
    /// Measured value; `None` where nothing was measured or it is not a number.
    pub measured: Option<f64>,
    /// Largest admissible value.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Why this limit.
    pub reason: &'static str,
    /// What was seen, or why it was skipped or failed.
    pub remark: String,
    /// Data for the figures.
    pub evidence: Option<Evidence>,
    /// Time spent [ms].
    pub wall_ms: f64,
}

/// Every case, in the order of reports.
pub fn cases() -> Vec<&'static Case> {
    events::CASES.iter().chain(steps::CASES).chain(critical::CASES).collect()
}

/// Runs every case for every method that it applies to, in parallel; `done` is told of each as it is judged.
pub fn run(seed: u64, done: &(dyn Fn(&JudgedCase) + Sync)) -> Vec<JudgedCase> {
    let mut list: Vec<(&Case, Option<MethodName>)> = Vec::new();
    for case in cases() {
        if case.methods.is_empty() {
            list.push((case, None));
        }
        list.extend(case.methods.iter().map(|method| (case, Some(*method))));
    }
    list.into_par_iter()
        .map(|(case, method)| {
            let judged = judge(case, Subject { method, seed });
            done(&judged);
            judged
        })
        .collect()
}

/// How many of `judged` came to what.
pub fn counts(judged: &[JudgedCase]) -> Counts {
    Counts::of(judged.iter().map(|case| case.verdict))
}

fn judge(case: &Case, subject: Subject) -> JudgedCase {
    let started = Instant::now();
    let lacks = subject.method.filter(|method| !method.is_built());
    let result = match lacks {
        Some(method) => Err(NotMeasured::skip(format!("this build leaves out {method}"))),
        None => (case.measure)(subject),
    };
    let (verdict, measured, remark, evidence) = match result {
        Ok(found) => {
            let verdict = found.verdict.unwrap_or_else(|| Verdict::of(found.value, case.limit));
            (verdict, Some(found.value).filter(|v| v.is_finite()), found.remark, found.evidence)
        }
        Err(NotMeasured::NotApplicable(reason)) => (Verdict::Skipped, None, reason, None),
        Err(NotMeasured::Broken(reason)) => (Verdict::Failed, None, reason, None),
    };
    let id = match subject.method {
        Some(method) => format!("{}/{method}", case.id),
        None => case.id.to_owned(),
    };
    JudgedCase {
        id,
        statement: case.statement,
        method: subject.method,
        verdict,
        measured,
        limit: case.limit,
        unit: case.unit,
        reason: case.reason,
        remark,
        evidence,
        wall_ms: started.elapsed().as_secs_f64() * 1e3,
    }
}

/// What a measurement is about.
#[derive(Clone, Copy, Debug)]
struct Subject {
    method: Option<MethodName>,
    seed: u64,
}

impl Subject {
    /// The method; the Taylor series where the case names none.
    fn method(self) -> MethodName {
        self.method.unwrap_or_default()
    }

    fn build(self, rtol: Option<f64>) -> Result<Method, NotMeasured> {
        Method::new(self.method(), &MethodOptions { rtol, ..MethodOptions::default() }).map_err(NotMeasured::broken)
    }

    /// A flight at the method's default tolerance; a refusal makes the case inapplicable, a failure breaks it.
    fn fly(self, problem: &Problem) -> Result<Flight, NotMeasured> {
        self.build(None)?.integrator().fly(problem, Detail::Events).map_err(|error| {
            if error.is_usage() { NotMeasured::skip(error.to_string()) } else { NotMeasured::broken(error) }
        })
    }

    /// The relative error that the method promises: round-off, or a multiple of its tolerance per step.
    ///
    /// The multiples are those by which the adapter widens the library's local tolerance into an error bar.
    fn promise(self) -> f64 {
        match self.method() {
            MethodName::TrBdf2 => 3.0 * RTOL_DEFAULT.powf(2.0 / 3.0),
            method if method.needs_diffsol() => 10.0 * RTOL_DEFAULT,
            _ => f64::EPSILON,
        }
    }
}

/// Expectations counted, the first that fails kept in words.
#[derive(Debug, Default)]
struct Violations {
    checks: usize,
    count: usize,
    first: String,
    notes: Vec<String>,
}

impl Violations {
    fn expect(&mut self, holds: bool, what: impl FnOnce() -> String) {
        self.checks += 1;
        if !holds {
            self.count += 1;
            if self.count == 1 {
                self.first = what();
            }
        }
    }

    fn measurement(self) -> Measurement {
        let mut remark = format!("{} checks", self.checks);
        for note in self.notes {
            remark = format!("{remark}; {note}");
        }
        if self.count > 0 {
            remark = format!("{remark}; first violation: {}", self.first);
        }
        // No check at all shows nothing.
        Measurement::new(if self.checks == 0 { f64::NAN } else { self.count as f64 }).remark(remark)
    }
}

/// The larger; NaN if either is.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// The flight in double-double.
fn exact(problem: &Problem) -> Result<Flight<TwoFloat>, NotMeasured> {
    Taylor::default().fly_in(&problem.cast::<TwoFloat>(), Detail::Events).map_err(NotMeasured::broken)
}

/// The exit margin in double-double, rounded: its sign is the outcome.
fn exact_margin(problem: &Problem) -> Result<f64, NotMeasured> {
    let margin = Energy::new().exit_margin_in(&problem.cast::<TwoFloat>()).map_err(NotMeasured::broken)?;
    margin.map(|(value, ..)| value.hi()).ok_or_else(|| NotMeasured::broken("the problem has no exit"))
}

/// Whether `outcome` is right for a margin of that sign; `Undecided` is not wrong.
fn is_right(outcome: Outcome, margin: f64) -> bool {
    match outcome {
        Outcome::Undecided => true,
        Outcome::Perforated => margin >= 0.0,
        _ => margin < 0.0,
    }
}

/// The scene of the paper's size on which other programs' critical velocity was seen to be wrong: 0.9 kg, 26.9 mm,
/// 36 MPa, S 12, k 2, H 0.30 m; an ogive of N* 0.106 in 2370 kg/m³, or no drag.
fn slab(drag: bool) -> Scene {
    let concrete = Concrete {
        diameter: 0.0269,
        nose_factor: 0.106,
        strength: 36e6,
        density: if drag { 2370.0 } else { 0.0 },
        static_factor: 12.0,
        inertia_factor: 1.0,
        crater_ratio: 2.0,
        crater_stiffness: CraterStiffness::Continuous,
        layers: Vec::new(),
    };
    Scene { thickness: Some(0.30), velocity: Some(400.0), ..Scene::of_concrete(0.9, concrete) }
}

fn resolve(scene: &Scene, speed: f64) -> Result<Problem, NotMeasured> {
    scene.resolve(speed).map_err(NotMeasured::broken)
}

fn critical_of(scene: &Scene) -> Result<f64, NotMeasured> {
    crate::studies::critical_velocity::exact(scene).map_err(NotMeasured::broken)
}

/// A problem of stages: laws with their ends.
fn staged(mass: f64, impact_speed: f64, exit_depth: f64, stages: &[Stage]) -> Problem {
    Problem { mass, impact_speed, exit_depth, stages: Stages::from_slice(stages), crater: None, target: Target::Stages }
}

/// Crater and tunnel outright.
fn concrete(mass: f64, impact_speed: f64, exit_depth: f64, crater: (f64, f64), tunnel: (f64, f64)) -> Problem {
    Problem {
        crater: Some(0),
        target: Target::CraterAndTunnel,
        ..staged(
            mass,
            impact_speed,
            exit_depth,
            &[Stage::crater(crater.0, crater.1), Stage::tunnel(tunnel.0, tunnel.1)],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_an_id_of_its_own_and_a_reason() {
        let mut ids: Vec<_> = cases().iter().map(|case| case.id).collect();
        let count = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), count);
        for case in cases() {
            assert!(case.limit >= 0.0 && case.limit.is_finite(), "{}", case.id);
            assert!(case.reason.len() > 20 && case.statement.len() > 20, "{}", case.id);
        }
    }

    #[test]
    fn a_case_without_a_check_shows_nothing() {
        assert!(Violations::default().measurement().value.is_nan());
        let mut one = Violations::default();
        one.expect(false, || "it is not so".to_owned());
        let measurement = one.measurement();
        assert!(measurement.value == 1.0 && measurement.remark.contains("it is not so"));
    }
}
