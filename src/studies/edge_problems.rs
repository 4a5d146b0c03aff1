//! Problems at the edges: grazing, coincident and close events, thin targets, extreme scales.
//!
//! The cases are those of `verification/edges.toml`, which put our own methods through them; [`super::diagnosis`] asks
//! any solver those that a program which takes a tolerance can answer.

use super::critical_velocity;
use crate::physics::{Concrete, CraterStiffness, Problem, Scene, Stage};

/// Concrete of 36 MPa with S = 12, continuous c and k = 2: diameter (m), N*, density (kg/m³).
pub fn concrete(diameter: f64, nose_factor: f64, density: f64) -> Concrete {
    Concrete {
        diameter,
        nose_factor,
        strength: 36e6,
        density,
        static_factor: 12.0,
        follows_eq14: false,
        inertia_factor: 1.0,
        crater_ratio: 2.0,
        crater_stiffness: CraterStiffness::Continuous,
        layers: Vec::new(),
    }
}

/// A scene of the paper's size for which other programs found a wrong critical velocity: 0.9 kg, 26.9 mm,
/// 36 MPa, S 12, k 2, H 0.30 m, 400 m/s; an ogive of N* 0.106 in 2370 kg/m³, or no drag.
pub fn slab(drag: bool) -> Scene {
    let concrete = concrete(0.0269, 0.106, if drag { 2370.0 } else { 0.0 });
    Scene { thickness: Some(0.30), velocity: Some(400.0), ..Scene::of_concrete(0.9, concrete) }
}

/// Depths of the exit (m) about the end of a crater that is `depth` (m) deep: at its end and an ulp beside it, and far
/// above.
pub fn thin_exits(depth: f64) -> [f64; 7] {
    [1e-9, 0.5 * depth, depth * (1.0 - 1e-12), depth.next_down(), depth, depth.next_up(), depth * (1.0 + 1e-12)]
}

/// A constant force against 10 m/s, which rests at 0.5 m, with the exit at 0.5 m times 1 ± 10^-j, j = 1 to 14.
pub fn both_crossings() -> impl Iterator<Item = Problem> {
    let at = |exit| Problem::of_stages(1.0, 10.0, [Stage::tunnel(100.0, 0.0)]).with_exit(exit);
    (1..=14).flat_map(move |j| [-1.0, 1.0].map(|side| at(0.5 * (1.0 + side * 10f64.powi(-j)))))
}

/// A force of 20 N over 1 m against 1 kg at 10 m/s, in stages that end at `ends` (m).
pub fn stage_ends(ends: &[f64]) -> Problem {
    let stages = ends.iter().chain([&f64::INFINITY]).map(|end| Stage::tunnel(20.0, 0.0).until(*end));
    Problem::of_stages(1.0, 10.0, stages).with_exit(1.0)
}

/// The slab at 500 m/s with a crater stiffness of 0.1 to 10 times the continuous one, with and without an exit.
pub fn force_jumps() -> Vec<Problem> {
    let jump = |factor: f64, exit| {
        let mut problem = Problem { exit_depth: exit, ..slab(true).resolve(500.0).ok()? };
        problem.stages[0].stiffness *= factor;
        Some(problem)
    };
    let factors = [0.1, 0.5, 2.0, 10.0];
    factors
        .into_iter()
        .flat_map(|factor| [f64::INFINITY, 0.2].into_iter().filter_map(move |exit| jump(factor, exit)))
        .collect()
}

/// Speeds (m/s) about the least at which the crater of the slab is left, by 10^-j, j = 1 to 15.
pub fn across_the_crater_end() -> Vec<Problem> {
    let scene = Scene { thickness: None, ..slab(true) };
    let Ok(law) = scene.resolve(1.0) else { return Vec::new() };
    let zero = (law.stages[0].end * law.stages[1].static_force / law.mass).sqrt();
    let offsets = (1..=15).flat_map(|j| [-1.0, 0.0, 1.0].map(|sign| sign * 10f64.powi(-j)));
    offsets.filter_map(|offset| scene.resolve(zero * (1.0 + offset)).ok()).collect()
}

/// The slab at 500 m/s with lengths by 1e-9: the motion takes picoseconds, at the same speed.
pub fn tiny() -> Option<Problem> {
    let base = slab(true).resolve(500.0).ok()?;
    let stages = base.stages.iter().map(|law| Stage {
        static_force: law.static_force * 1e9,
        stiffness: law.stiffness * 1e18,
        drag: law.drag * 1e9,
        end: law.end * 1e-9,
        ..*law
    });
    Some(Problem { exit_depth: base.exit_depth * 1e-9, stages: stages.collect(), ..base })
}

/// Problems at one kind of edge.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its name in `verification/edges.toml`.
    pub id: &'static str,
    /// What is asked, as a claim about whoever answers.
    pub statement: &'static str,
    /// The problems.
    pub problems: Vec<Problem>,
}

/// The cases that any solver may be asked: no stage of no length, no scale beyond 2^±100.
pub fn cases() -> Vec<Case> {
    let case = |id, statement, problems: Vec<Problem>| Case { id, statement, problems };
    let mut near_critical = Vec::new();
    for drag in [false, true] {
        let Ok(critical) = critical_velocity::exact_or_refined(&slab(drag)) else { continue };
        let offsets = (1..=8).flat_map(|j| [-1.0, 1.0].map(|sign| sign * 10f64.powi(-j)));
        near_critical.extend(offsets.filter_map(|offset| slab(drag).resolve(critical * (1.0 + offset)).ok()));
    }
    let crater = |offset: f64| {
        let (crater, tunnel) = (Stage::crater(1.0, 1.0), Stage::tunnel(1.0, 0.0));
        Problem::crater_and_tunnel(1.0, 1.0 + offset, Some(crater), tunnel).with_exit(1.0)
    };
    let thin = slab(true).resolve(400.0).map_or(Vec::new(), |base| {
        thin_exits(base.stages[0].end).map(|exit| Problem { exit_depth: exit, ..base.clone() }).to_vec()
    });
    let scaled = |power: i32, exit| {
        let scale = |x: f64| x * 2f64.powi(power);
        let (crater, tunnel) = (Stage::crater(scale(8.0), 0.5), Stage::tunnel(scale(4.0), scale(0.25)));
        Problem::crater_and_tunnel(scale(1.0), 2.0, Some(crater), tunnel).with_exit(exit)
    };
    let gap = Stage::free().until(1.0);
    let gaps = vec![
        Problem::of_stages(1.0, 3.0, [gap, Stage::free()]).with_exit(2.0),
        Problem::of_stages(1.0, 3.0, [gap, Stage::tunnel(9.0, 0.0)]),
    ];
    let slow = |power| Problem::of_stages(2.0, 10f64.powi(power), [Stage::tunnel(1e5, 3.0)]);
    vec![
        case("E1", "near V_c the outcome is right: V0 = V_c (1 ± 10^-j), with and without drag", near_critical),
        case(
            "E3",
            "an exit just before rest is found, and none just behind it: H = X (1 ± 10^-j)",
            both_crossings().collect(),
        ),
        case(
            "E5",
            "rest near the end of the crater, where the exit is: V0 off by 1 % and 0.01 %",
            [-1e-2, -1e-4, 1e-4, 1e-2].map(crater).to_vec(),
        ),
        case("E6", "targets from 1e-9 m to k d and an ulp are left at their far side", thin),
        case(
            "E7",
            "ten ends of stages within one step are passed",
            vec![stage_ends(&[0.1, 0.2, 0.3, 0.31, 0.32, 0.45, 0.5, 0.6, 0.61, 0.9])],
        ),
        case(
            "E8",
            "an end of a stage at 1e-9 of the distance behind another is passed",
            vec![stage_ends(&[0.6, 0.600_000_000_6, 0.85])],
        ),
        case(
            "E10",
            "forces and mass scaled by 2^-100 and 2^100 change nothing",
            [-100, 0, 100].iter().flat_map(|power| [f64::INFINITY, 0.75].map(|exit| scaled(*power, exit))).collect(),
        ),
        case("E11", "a stage without force is crossed at the speed of its start", gaps),
        case("E13", "a motion of picoseconds keeps its accuracy", tiny().into_iter().collect()),
        case("E14", "a stop is found at V0 from 1 down to 1e-12 m/s", [0, -3, -6, -9, -12].map(slow).to_vec()),
        case("E16", "a force that jumps at k d, by a tenth to ten times, costs no accuracy", force_jumps()),
        case(
            "E18",
            "the depth of rest is continuous about the end of the crater: V0 = sqrt(k d P/M) (1 ± 10^-j)",
            across_the_crater_end(),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_that_a_solver_is_asked_has_problems_with_an_answer() {
        for case in cases() {
            let is_answered = |problem: &&Problem| super::super::error::Truth::of(problem).is_ok();
            let answered = case.problems.iter().filter(is_answered).count();
            assert!(answered > 0 && answered == case.problems.len(), "{}: {answered}", case.id);
        }
    }
}
