#![expect(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]
use super::*;
use crate::physics::closed_form::{CriticalError, critical, critical_of_stages, squared_speed_at};
use crate::physics::reference::{self, Conditions, Exact, ExactFlight, Source};
use crate::physics::{Advice, EventKind, Outcome, Scene, Stage, Stages, Target};
use crate::studies::error::Errors;
use crate::studies::extreme_scenes;
use crate::studies::quantity::Quantity;
use crate::studies::random_problems::Kind;
use crate::testing::{Random, kinds, of_stages};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Allowed error of a critical velocity in ulps over max(1, condition): measured 2.6, 20,000 scenes.
const LIMIT: f64 = 8.0;

/// Allowed error in units of rounding, each 1/2 to 1 ulp, over max(1, condition).
const ROUNDINGS_MAX: f64 = 4.0;

const UNCONDITIONED: Conditions = [1.0; 5];

/// Random cases of a test; [`twenty_thousand_cases_of_each_kind_are_within_their_limits`] goes on from there.
const CASES: u32 = 1_000;

/// `scene` at 1 m/s with the exit depth `exit_depth`, and how its c is chosen.
fn model_of(scene: &Scene, exit_depth: f64) -> (Problem, CraterStiffness) {
    let problem = scene.resolve(1.0).unwrap().with_exit(exit_depth);
    (problem, scene.concrete().unwrap().crater_stiffness)
}

fn solve(problem: &Problem) -> Result<Flight, IntegrationError> {
    ClosedForm.solve(problem, Detail::Events)
}

fn ulp(value: f64) -> f64 {
    value.next_up() - value
}

fn ulps(exact: &Exact, value: f64) -> f64 {
    let near = exact.to_f64();
    if near == 0.0 {
        if value == 0.0 { 0.0 } else { f64::INFINITY }
    } else {
        exact.relative_error(value) * near / ulp(near)
    }
}

fn ulps_of(exact: &Exact, value: f64, scale: &Exact) -> f64 {
    let near = scale.to_f64();
    exact.error_over(value, scale) * near / ulp(near)
}

/// Errors in units of rounding over max(1, condition); the conditions are asked for only where an error is above the limit.
fn errors(solution: &Flight, exact: &ExactFlight, conditions: impl FnOnce() -> Conditions) -> Errors {
    let errors = Errors::in_50_digits(solution, exact, &UNCONDITIONED);
    if errors.exceed(ROUNDINGS_MAX) { errors.over(&conditions()) } else { errors }
}

/// The greatest error of each quantity.
#[derive(Debug, Default)]
struct Worst(BTreeMap<Quantity, f64>);

impl Worst {
    fn note(&mut self, errors: Errors) {
        for (error, quantity) in errors.0 {
            let worst = self.0.entry(quantity).or_default();
            *worst = worst.max(error);
        }
    }
}

#[test]
fn flights_of_random_scenes_are_within_8_ulp_times_condition_of_50_digits() {
    compare_random_scenes(CASES);
}

/// Scenes over the whole range of the groups; those at the edges are the claim S9.
fn compare_random_scenes(cases: u32) {
    let (mut worst, mut worst_critical) = (Worst::default(), 0.0_f64);
    let mut undecidable = 0;
    for case in 0..cases {
        let scene = extreme_scenes::scene(1, 2 * u64::from(case));
        let speed = scene.velocity.unwrap();
        let source = Source::Scene(&scene, speed);
        let exact = reference::flight(source).unwrap();
        let stiffness = scene.concrete().unwrap().crater_stiffness;
        let solution = solve_crater_and_tunnel(&scene.resolve(speed).unwrap(), stiffness).unwrap();
        if let (Some(margin), Some(bar), Some(exact)) =
            (solution.exit_margin, solution.exit_margin_error, &exact.exit_margin)
        {
            let off = (margin - exact.to_f64()).abs();
            // The error bound is that of the problem; resolving the scene adds the errors of its coefficients.
            assert!(off <= 2.0 * bar, "case {case}: margin {margin:e} is off by {off:e}, bar {bar:e}\n{scene:?}");
            if margin.abs() <= bar {
                undecidable += 1;
                continue;
            }
        }
        assert!(solution.outcome.agrees_with(exact.outcome), "case {case}: {solution:?}\n{exact:?}\n{scene:?}");
        // Rest within round-off of k d may name either stage.
        if solution.outcome == exact.outcome {
            let errors = errors(&solution, &exact, || reference::conditions(source).unwrap());
            assert!(!errors.exceed(ROUNDINGS_MAX), "case {case}: {errors:?}\n{solution:?}\n{scene:?} V0 = {speed:e}");
            worst.note(errors);
        }
        let Some(thickness) = scene.thickness else { continue };
        let exact = reference::critical(source).unwrap();
        let (model, stiffness) = model_of(&scene, thickness);
        match critical(&model, stiffness) {
            Ok(critical) => {
                let mut error = ulps(&exact.velocity, critical.velocity).max(ulps(&exact.energy, critical.energy));
                if error > LIMIT {
                    // That of the energy is larger: twice it, and one for the mass.
                    error /= reference::critical_condition(source).unwrap().max(1.0);
                }
                assert!(error <= LIMIT, "case {case}: V_c {critical:?} off by {error} ulp\n{scene:?}");
                worst_critical = worst_critical.max(error);
            }
            Err(error) => {
                assert_eq!(error, CriticalError::OutOfRange);
                assert!(exact.energy.to_f64() > 1e300, "case {case}: E_c = {}", exact.energy.to_decimal(5));
            }
        }
    }
    assert!(f64::from(undecidable) < 0.05 * f64::from(cases), "{undecidable} inside the bar");
    println!("worst, in roundings over max(1, condition): {worst:?}, V_c and E_c {worst_critical}");
}

/// A random list of one to four stages of every family that has a form, resisting and driving, with and without
/// a far side; forces up to a thousand times what stops the projectile within its stage, and down to nothing.
fn roll_stages(dice: &mut Random) -> Problem {
    let (mass, length, speed) = (dice.log_uniform(1e-3, 1e3), dice.log_uniform(1e-3, 1e1), dice.log_uniform(1e-1, 1e3));
    let energy = mass * speed * speed;
    // Half of them alone, so that drives are not all behind a stop.
    let count = if dice.chance(1.0 / 2.0) { 1 } else { 2 + dice.below(3) };
    let mut stages = Stages::new();
    let mut end = 0.0;
    for index in 0..count {
        let family = dice.below(8);
        let sign = if dice.chance(1.0 / 3.0) { -1.0 } else { 1.0 };
        let p = sign * energy / length * dice.log_uniform(1e-4, 1e3);
        let s = energy / length / length * dice.log_uniform(1e-4, 1e3);
        let r = mass * speed / length * dice.log_uniform(1e-4, 1e3);
        let q = mass / length * dice.log_uniform(1e-4, 1e4);
        let (p, s, r, q) = match family {
            0 => (p, 0.0, 0.0, 0.0),
            1 => (p, s, 0.0, 0.0),
            2 => (p, 0.0, 0.0, q),
            3 => (p, 0.0, r, 0.0),
            4 => (p, s, r, 0.0),
            5 => (0.0, 0.0, r, 0.0),
            // Drag alone: exit times grow as e^{y/2} and soon leave the range.
            6 => (0.0, 0.0, 0.0, q.min(1e1 * mass / length)),
            _ => (0.0, 0.0, 0.0, 0.0),
        };
        end += length * dice.log_uniform(1e-3, 3.0);
        let end = if index + 1 == count { f64::INFINITY } else { end };
        stages.push(Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end });
    }
    let exit_depth = if dice.chance(1.0 / 4.0) { f64::INFINITY } else { length * dice.log_uniform(0.01, 10.0) };
    Problem::of_stages(mass, speed, stages).with_exit(exit_depth)
}

/// Compares flights with the reference; counts those that stop, that perforate, and that never end.
fn compare_stages(problems: impl Iterator<Item = Problem>) -> [u32; 3] {
    let (mut worst, mut ended) = (Worst::default(), [0; 3]);
    for (case, problem) in problems.enumerate() {
        let source = Source::Problem(&problem);
        let (solution, exact) = match (solve(&problem), reference::flight(source)) {
            (Ok(solution), Ok(exact)) => (solution, exact),
            (Err(IntegrationError::NeverEnds { .. }), Err(reference::ReferenceError::NeverEnds)) => {
                ended[2] += 1;
                continue;
            }
            (solution, exact) => panic!("case {case}: {solution:?}\n{exact:?}\n{problem:?}"),
        };
        let undecided = solution.outcome == Outcome::Undecided;
        assert!(undecided || solution.outcome == exact.outcome, "case {case}: {solution:?}\n{exact:?}\n{problem:?}");
        assert_eq!(solution.stage, exact.stage);
        ended[usize::from(solution.outcome == Outcome::Perforated)] += 1;
        let kinds = solution.events.iter().map(|e| e.kind);
        assert!(kinds.eq(exact.events.iter().map(|e| e.kind)), "case {case}");
        let errors = errors(&solution, &exact, || reference::conditions(source).unwrap());
        assert!(!errors.exceed(ROUNDINGS_MAX), "case {case}: {errors:?}\n{solution:?}\n{problem:?}");
        worst.note(errors);
        if let (Some(margin), Some(bar), Some(exact)) =
            (solution.exit_margin, solution.exit_margin_error, &exact.exit_margin)
        {
            let off = exact.error_over(margin, &reference::Exact::one());
            assert!(
                off <= bar,
                "case {case}: margin {margin:e} is off by {off:e}, bar {bar:e}\n{solution:?}\n{problem:?}"
            );
        }
    }
    println!("worst, in roundings over max(1, condition): {worst:?}");
    ended
}

#[test]
fn oscillators_about_critical_damping_are_within_8_ulp_times_condition_of_50_digits() {
    compare_oscillators(CASES / 50);
}

/// Springs and dashpots about critical damping, where differences of rates vanish, pushed and pulled, from hardly
/// any speed to much; left close before and behind rest, where the speed is none for Newton's method to divide by.
fn compare_oscillators(of_each: u32) {
    let mut dice = Random::new(6);
    let mut problems = Vec::new();
    for off in [0.0, 1e-12, -1e-12, 1e-8, 1e-5, -1e-5, 1e-3, -1e-3, 2e-2, 0.1] {
        for _ in 0..of_each {
            // The frequency a whole number and M = 1: critical damping is met exactly.
            let w = dice.log_uniform(1.0, 10.0).floor();
            let speed = dice.log_uniform(1e-6, 1e2);
            let pull = dice.log_uniform(1e-3, 1e3) * if dice.chance(1.0 / 3.0) { 1.0 } else { -1.0 };
            let oscillator = Stage { stiffness: w * w, viscosity: 2.0 * w * (1.0 + off), ..Stage::tunnel(pull, 0.0) };
            let mut endless = problem(&[oscillator], 1.0, speed, f64::INFINITY);
            endless.crater = None;
            endless.target = Target::Stages;
            let reach = solve(&endless).map_or(-pull / (w * w), |solution| solution.end.depth);
            let part = dice.log_uniform(1e-3, 1.0);
            let exit_depth = reach * if dice.chance(1.0 / 2.0) { part } else { 1.0 - 1e-3 * part };
            problems.push(endless.clone());
            problems.push(Problem { exit_depth, ..endless });
        }
    }
    let [stopped, perforated, endless] = compare_stages(problems.into_iter());
    assert!(stopped > 20 && perforated > 20 && endless > 20, "{stopped}, {perforated}, {endless}");
}

#[test]
fn flights_through_stages_of_every_family_are_within_8_ulp_times_condition_of_50_digits() {
    compare_random_stages(CASES);
}

/// Pieces of tables, whose force falls with depth as often as it rises, and drives.
fn roll_table(dice: &mut Random) -> Problem {
    loop {
        if let Some(problem) = Kind::Table.draw(dice) {
            return problem;
        }
    }
}

#[test]
fn flights_through_tables_are_within_8_ulp_times_condition_of_50_digits() {
    let mut dice = Random::new(9);
    let [stopped, perforated, _] = compare_stages((0..CASES / 10).map(|_| roll_table(&mut dice)));
    assert!(stopped > 30 && perforated > 30, "{stopped}, {perforated}");
}

fn compare_random_stages(cases: u32) {
    let mut dice = Random::new(2);
    let ended = compare_stages((0..cases).map(|_| roll_stages(&mut dice)));
    assert!(ended.iter().all(|n| 10 * n > cases), "stopped, perforated, endless: {ended:?}");
}

#[test]
#[ignore = "two minutes of a processor, many more without optimization: .ci/run has it"]
fn twenty_thousand_cases_of_each_kind_are_within_their_limits() {
    const MANY: u32 = 20_000;
    // The oscillators take as long as all others.
    rayon::join(
        || compare_oscillators(MANY / 50),
        || {
            compare_random_scenes(MANY);
            compare_random_stages(MANY);
            compare_critical_velocities(MANY, roll_stages);
        },
    );
}

#[test]
fn critical_velocity_of_stages_is_within_8_ulp_times_condition_of_50_digits() {
    compare_critical_velocities(CASES, roll_stages);
    compare_critical_velocities(CASES / 10, roll_table);
}

fn compare_critical_velocities(cases: u32, roll: impl Fn(&mut Random) -> Problem) {
    let mut dice = Random::new(3);
    let (mut worst, mut zero, mut done) = (0.0_f64, 0, 0);
    while done < cases {
        let mut problem = roll(&mut dice);
        for stage in &mut problem.stages {
            // Stiffness with drag among them, which has V(x) and therefore a critical velocity.
            stage.drag += stage.viscosity * problem.impact_speed.recip();
            stage.viscosity = 0.0;
        }
        let source = Source::Problem(&problem);
        if !problem.has_exit() {
            assert_eq!(critical_of_stages(&problem), Err(CriticalError::NoExit));
            continue;
        }
        done += 1;
        let exact = reference::critical(source).unwrap();
        let Ok(critical) = critical_of_stages(&problem) else {
            assert!(exact.energy.to_f64() > 1e290, "{exact:?}");
            continue;
        };
        if critical.velocity == 0.0 {
            zero += 1;
        }
        let mut error = ulps(&exact.velocity, critical.velocity);
        if error > LIMIT {
            error /= reference::critical_condition(source).unwrap().max(1.0);
        }
        assert!(error <= LIMIT, "{error} ulp\n{problem:?}\n{critical:?} {}", exact.velocity.to_decimal(20));
        worst = worst.max(error);
    }
    println!("worst, in ulps over max(1, condition): {worst}; driven throughout: {zero}");
    assert!(zero > 0);
}

#[test]
fn dimensionless_critical_energies_are_those_of_the_table() {
    // E_c/(d³ fc S) at k = 2 by Li & Chen (2003): H/d, N, value.
    for (thickness, n, energy) in [
        (1.0, 5.0, 0.158_907_777_799_397_2),
        (2.0, 20.0, 0.25 * PI),
        (10.0, 100.0, 7.585_602_604_876_231),
        (18.0, 5.0, 498.214_509_251_034_6),
    ] {
        let target = Problem::continuous(n, 1.0, 2.0, Stage::tunnel(0.25 * PI, 0.25 * PI)).with_exit(thickness);
        let computed = critical(&target, CraterStiffness::Continuous).unwrap().energy;
        assert!((computed / energy - 1.0).abs() < 2e-15, "{computed} for {energy}");
    }
}

fn problem(stages: &[Stage], mass: f64, impact_speed: f64, exit_depth: f64) -> Problem {
    let staged = of_stages(mass, impact_speed, exit_depth, stages);
    Problem { crater: Some(0), target: Target::CraterAndTunnel, ..staged }
}

#[test]
fn rest_at_the_exit_in_a_viscous_stage_is_there() {
    let viscous = [Stage { stiffness: 3.0, viscosity: 1.0, ..Stage::tunnel(7.0, 0.0) }];
    let rest = solve(&problem(&viscous, 1.0, 10.0, f64::INFINITY)).unwrap().end.depth;
    let events = solve(&problem(&viscous, 1.0, 10.0, rest)).unwrap().events;
    assert_eq!(events[0].kind, EventKind::Exit);
}

#[test]
fn the_path_keeps_the_energy_and_ends_where_the_flight_ends() {
    let stages = [
        Stage { end: 0.1, ..Stage::crater(8e6, 0.1) },
        Stage { end: 0.2, ..Stage::tunnel(-3e5, 2.0) },
        Stage { stiffness: 1e5, end: 0.3, ..Stage::tunnel(1e5, 0.0) },
        Stage::tunnel(2e5, 3.0),
    ];
    let scene = problem(&stages, 2.0, 300.0, f64::INFINITY);
    let solution = solve(&scene).unwrap();
    let mut before = State::at_impact(&scene);
    for step in 1..=1000 {
        let depth = solution.end.depth * f64::from(step) / 1000.0;
        let state = state_at(&scene, depth).unwrap().unwrap();
        let w = squared_speed_at(&scene, depth).unwrap();
        assert!((state.velocity * state.velocity - w).abs() < 1e-15 * 9e4 * 20.0, "{state} against {w}");
        // The mean speed of a short step lies between the speeds at its ends, but for rounding.
        let mean = (state.depth - before.depth) / (state.time - before.time);
        let (slow, fast) = (before.velocity.min(state.velocity), before.velocity.max(state.velocity));
        // A driven stage that begins inside the step may raise the speed between.
        assert!(mean > slow * 0.98 && mean < fast * 1.02, "{before} to {state}");
        before = state;
    }
    assert_eq!(state_at(&scene, solution.end.depth).unwrap(), Some(solution.end));
    assert_eq!(state_at(&scene, solution.end.depth.next_up()).unwrap(), None);
    assert_eq!(state_at(&scene, 0.0).unwrap(), Some(State::at_impact(&scene)));
    for nowhere in [f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(state_at(&scene, nowhere).unwrap(), None);
    }
    let thin = Problem { exit_depth: 0.15, ..scene };
    assert!(state_at(&thin, 0.15).unwrap().is_some());
    assert_eq!(state_at(&thin, 0.16).unwrap(), None);
}

#[test]
fn a_viscous_stage_hides_the_speed_behind_its_start_only() {
    let stages = [Stage { viscosity: 1.0, ..Stage::tunnel(1.0, 0.0) }];
    assert_eq!(squared_speed_at(&problem(&stages, 1.0, 3.0, 2.0), 0.0), Some(9.0));
    assert_eq!(squared_speed_at(&problem(&stages, 1.0, 3.0, 2.0), 1e-9), None);
}

#[test]
fn the_bar_of_the_margin_is_eight_epsilons_of_its_sum() {
    // M V0²/2 = 9e4 J. The crater's spring over 0.1 m, and 1e5 N over the whole depth: 0.25 m, or that of rest.
    let stages = [Stage::crater(4e6, 0.1), Stage::tunnel(-1e5, 2.0)];
    for (exit_depth, on_the_way) in [(0.25, 2.0), (0.1, 1.0)] {
        let solution = solve(&problem(&stages, 2.0, 300.0, exit_depth)).unwrap();
        let tunnel = if exit_depth > 0.1 { 1e5 * exit_depth } else { 0.0 };
        let sum = 1.0 + solution.exit_margin.unwrap() + (0.5 * 4e6 * 0.01 + tunnel) / 9e4;
        let bar = solution.exit_margin_error.unwrap() / (8.0 * f64::EPSILON * on_the_way);
        assert!((bar / sum - 1.0).abs() < 1e-14, "{bar} for {sum}");
    }
}

#[test]
fn an_endless_flight_and_a_stage_without_a_form_are_named() {
    for (stage, why) in [
        (Stage::tunnel(0.0, 0.0), "no force acts in the last stage"),
        (Stage::tunnel(0.0, 1.0), "drag alone never brings it to rest"),
        (Stage::tunnel(-1.0, 1.0), "the last stage drives the projectile"),
        (Stage { viscosity: 1.0, ..Stage::tunnel(0.0, 0.0) }, "viscosity alone never brings it to rest"),
        (Stage { viscosity: 1.0, ..Stage::tunnel(-1.0, 0.0) }, "its drive and its viscosity balance"),
    ] {
        let error = solve(&problem(&[stage], 1.0, 10.0, f64::INFINITY)).unwrap_err();
        assert_eq!(error, IntegrationError::NeverEnds { why, last: State { time: 0.0, depth: 0.0, velocity: 10.0 } });
    }
    // The stiff scene creeps towards |p|/s = 10: it leaves at 9 and would never reach 10.
    let stiff = Stage { static_force: -1000.0, stiffness: 100.0, viscosity: 1000.0, drag: 0.0, end: f64::INFINITY };
    assert_eq!(solve(&problem(&[stiff], 1.0, 1.0, 9.0)).unwrap().outcome, Outcome::Perforated);
    assert!(matches!(solve(&problem(&[stiff], 1.0, 1.0, 10.0)), Err(IntegrationError::NeverEnds { .. })));
    // Critical damping, and a drive that V0 just balances: x = 10 (1 - e^-t).
    let critical = Stage { stiffness: 1.0, viscosity: 2.0, ..Stage::tunnel(-10.0, 0.0) };
    let half = solve(&problem(&[critical], 1.0, 10.0, 5.0)).unwrap().end;
    let off = [half.time / std::f64::consts::LN_2 - 1.0, half.velocity / 5.0 - 1.0];
    assert!(off.iter().all(|off| off.abs() < 1e-15), "{half}");
    assert!(matches!(solve(&problem(&[critical], 1.0, 10.0, 20.0)), Err(IntegrationError::NeverEnds { .. })));
    let both = Stage { viscosity: 1.0, ..Stage::tunnel(1.0, 1.0) };
    let error = solve(&problem(&[Stage::crater(1.0, 1.0), both], 1.0, 10.0, 3.0)).unwrap_err();
    assert!(error.is_usage(), "{error}");
    let refusal = "closed-form cannot treat this scene: stage 1 has no closed form: viscosity and drag act together";
    assert!(error.to_string().contains(refusal), "{error}");
    // V0 = r x/M: the whole speed is lost just before the exit. And a drive that V0 just balances: the motion is the
    // fast decay alone, x = 1 - e^(-2 t).
    let lost = Stage { viscosity: 1.0, ..Stage::tunnel(0.0, 0.0) };
    let balanced = Stage { stiffness: 1.0, viscosity: 2.5, ..Stage::tunnel(-1.0, 0.0) };
    for (stage, speed, exit_depth) in [(lost, 10.0, 10.0 + 1.5e-14), (balanced, 2.0, 1.5)] {
        let error = solve(&problem(&[stage], 1.0, speed, exit_depth)).unwrap_err();
        assert!(matches!(error, IntegrationError::NeverEnds { .. }), "{error}");
    }
    // At the exit and not before: there without speed, and the margin within its error bound.
    for exit_depth in [10.0, 10.0 + 4e-15] {
        let within = solve(&problem(&[lost], 1.0, 10.0, exit_depth)).unwrap();
        assert_eq!((within.end.depth, within.exit_margin), (exit_depth, Some(0.0)));
    }
    // Until the speed is an epsilon of what it was, M/r ln(1/eps), here behind a gap that takes 0.1 s.
    let (gap, slowing) = (Stage { end: 1.0, ..Stage::tunnel(0.0, 0.0) }, Stage { viscosity: 4.0, ..lost });
    let within = solve(&problem(&[gap, slowing], 2.0, 10.0, 6.0)).unwrap().end;
    assert!((within.time / (0.1 + 0.5 * 36.043_653_389_117_15) - 1.0).abs() < 1e-15, "{within}");
    // It matters only to a flight that gets there.
    assert!(solve(&problem(&[Stage::crater(1e3, 1.0), both], 1.0, 10.0, 3.0)).is_ok());
}

#[test]
fn a_number_out_of_range_is_an_error_and_not_an_infinity() {
    let heavy = solve(&problem(&[Stage::tunnel(1e-300, 0.0)], 1e300, 1e100, f64::INFINITY));
    assert!(matches!(heavy, Err(IntegrationError::NotFinite { .. })), "{heavy:?}");
    // Drag alone over a thousand drag lengths: e^1000 s.
    let late = solve(&problem(&[Stage::tunnel(0.0, 1.0)], 1.0, 10.0, 1000.0));
    assert!(matches!(late, Err(IntegrationError::NotFinite { .. })), "{late:?}");
    let continuous = CraterStiffness::Continuous;
    let bare = |mass: f64, tunnel: Stage| Problem::crater_and_tunnel(mass, 1.0, None, tunnel);
    let target = bare(1.0, Stage::tunnel(1.0, 1.0));
    assert_eq!(critical(&target.clone().with_exit(0.0), continuous).map(|critical| critical.energy), Ok(0.0));
    assert_eq!(critical(&target.clone().with_exit(400.0), continuous), Err(CriticalError::OutOfRange));
    assert_eq!(critical(&target, continuous), Err(CriticalError::NoExit));
    assert!(critical(&target.with_exit(340.0), continuous).is_ok());
    // 1e-8 kg and 1e302 J: V_c² = 2e310 is out of range, V_c is not.
    let light = critical(&bare(1e-8, Stage::tunnel(1e302, 0.0)).with_exit(1.0), continuous).unwrap();
    assert!((light.velocity / (2.0_f64.sqrt() * 1e155) - 1.0).abs() < 1e-15);
}

#[test]
fn a_barrier_before_a_drive_decides_the_critical_velocity() {
    // 2 kg: 0.1 m of 1 MN cost 1e5 J; the drive behind gives more than the last metre takes.
    let stages = [
        Stage { end: 0.1, ..Stage::tunnel(1e6, 0.0) },
        Stage { end: 0.5, ..Stage::tunnel(-1e6, 0.0) },
        Stage::tunnel(1e5, 0.0),
    ];
    let critical = critical_of_stages(&problem(&stages, 2.0, 1.0, 1.5)).unwrap();
    assert!((critical.energy / 1e5 - 1.0).abs() < 4.0 * f64::EPSILON);
    let viscous = [Stage { viscosity: 1.0, ..stages[2] }];
    assert_eq!(critical_of_stages(&problem(&viscous, 2.0, 1.0, 1.5)), Err(CriticalError::Viscous(0)));
}

#[test]
fn within_round_off_of_the_exit_a_stop_is_not_deeper_than_the_exit() {
    let mut dice = Random::new(4);
    let (mut stops, mut at_exit) = (0, 0);
    for _ in 0..200 {
        let stages = [Stage::tunnel(dice.log_uniform(1e4, 1e6), dice.log_uniform(1e-2, 1e2))];
        let exit_depth = dice.log_uniform(0.01, 1.0);
        let critical = critical_of_stages(&problem(&stages, 2.0, 1.0, exit_depth)).unwrap().velocity;
        let mut speed = critical;
        for _ in 0..10 {
            let solution = solve(&problem(&stages, 2.0, speed, exit_depth)).unwrap();
            assert!(solution.end.depth <= exit_depth, "{solution:?}");
            let stops_there = kinds(&solution.events) == [EventKind::Rest];
            stops += u32::from(stops_there);
            at_exit += u32::from(stops_there && solution.end.depth == exit_depth);
            speed = speed.next_down();
        }
    }
    assert!(stops > 100 && at_exit > 0, "{stops} stops, {at_exit} of them at the exit but for rounding");
}

#[test]
fn speed_over_depth_with_stiffness_and_drag_is_that_of_the_reference() {
    let mut dice = Random::new(5);
    let mut worst = 0.0_f64;
    for case in 0..3 {
        let (p, s, q) = (dice.log_uniform(1e-2, 1e1), dice.log_uniform(1e-2, 1e1), dice.log_uniform(1e-6, 1e1));
        let stage = Stage { stiffness: s, ..Stage::tunnel(if dice.chance(1.0 / 2.0) { p } else { -p }, q) };
        // The reference takes the time of each by quadrature, which is slow: few cases.
        let scene = problem(&[stage], 1.0, 3.0, dice.log_uniform(1e-3, 1e-1));
        let source = Source::Problem(&scene);
        let Ok(exact) = reference::flight(source) else { panic!("case {case}: {scene:?}") };
        assert_eq!(exact.outcome, Outcome::Perforated);
        let w = squared_speed_at(&scene, scene.exit_depth).unwrap();
        worst = worst.max(ulps_of(&exact.end.velocity, w.sqrt(), &exact.impact_speed));
    }
    assert!(worst <= LIMIT, "{worst} ulps of V0");
}

#[test]
fn a_trajectory_gives_no_depth_twice_and_stays_at_its_end_in_the_stage_it_ended_in() {
    assert_eq!(ClosedForm.name(), "closed-form");
    let stages = [
        Stage::crater(8.0e6, 0.1),
        Stage { end: 0.1, ..Stage::tunnel(3e5, 0.0) },
        Stage { end: 0.2, ..Stage::tunnel(1e5, 1.0) },
        Stage::tunnel(2e5, 0.0),
    ];
    let next = 0.1_f64.next_up();
    // Exits at a stage end, behind it, one spacing behind it, and where two stages end.
    for (exit_depth, last) in [(0.2, 2), (0.3, 3), (next, 2), (0.1, 0)] {
        let samples =
            ClosedForm.solve(&of_stages(2.0, 400.0, exit_depth, &stages), Detail::Trajectory).unwrap().trajectory;
        assert_eq!(samples.len() == 2 * INTERVALS as usize + 1, exit_depth == 0.2, "{exit_depth}");
        assert!(samples.windows(2).all(|w| w[0].state.depth < w[1].state.depth), "{exit_depth}");
        for sample in &samples {
            let State { depth, velocity, .. } = sample.state;
            let stage = match depth {
                x if x == exit_depth => last,
                x if x < 0.1 => 0,
                x if x < 0.2 => 2,
                _ => 3,
            };
            assert_eq!(sample.stage, stage, "{depth} of {exit_depth}");
            assert_eq!(sample.force, stages[stage].force(depth, velocity));
        }
    }
}
