//! Relations that hold between flights whatever the scene, without any known answer; those between flights that must be
//! the same are claims, `invariant/` and S8.
#![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]

use penetrode::integrators::{Detail, Energy, Flight, Integrator, Taylor};
use penetrode::physics::{Outcome, Problem, Stage, Stages};
use proptest::prelude::*;

/// Mass, V0, k d, P, Q, c: a crater and a tunnel of ordinary or less ordinary size, the force continuous at k d.
#[derive(Clone, Copy, Debug)]
struct Shot {
    mass: f64,
    speed: f64,
    crater: f64,
    force: f64,
    drag: f64,
}

impl Shot {
    fn problem(self, exit: f64) -> Problem {
        let Self { mass, speed, crater, force, drag } = self;
        Problem::continuous(mass, speed, crater, Stage::tunnel(force, drag)).with_exit(exit)
    }

    /// Depth of rest without a far side.
    fn reach(self) -> f64 {
        solve(&self.problem(f64::INFINITY)).end.depth
    }
}

fn shots() -> impl Strategy<Value = Shot> {
    (-2.0..2.0, 0.0..3.5, -3.0..0.0, 3.0..7.0, -4.0..1.0).prop_map(|(m, v, x, p, q): (f64, f64, f64, f64, f64)| Shot {
        mass: 10f64.powf(m),
        speed: 10f64.powf(v),
        crater: 10f64.powf(x),
        force: 10f64.powf(p),
        drag: 10f64.powf(q),
    })
}

fn solve(problem: &Problem) -> Flight {
    Taylor::default().solve(problem, Detail::Events).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn depth_grows_with_mass_and_speed_and_falls_with_force_and_drag(shot in shots(), more in 1.01..10.0f64) {
        let reach = shot.reach();
        let [faster, stronger, heavier] = [
            Shot { speed: shot.speed * more, ..shot },
            Shot { force: shot.force * more, ..shot },
            Shot { mass: shot.mass * more, ..shot },
        ]
        .map(Shot::reach);
        prop_assert!(faster > reach, "{faster} {reach}");
        prop_assert!(stronger < reach, "{stronger} {reach}");
        prop_assert!(heavier > reach, "{heavier} {reach}");
        let at_given_c = |drag: f64| {
            let mut problem = shot.problem(f64::INFINITY);
            problem.stages[1].drag = drag;
            solve(&problem).end.depth
        };
        prop_assert!(at_given_c(shot.drag * more) <= at_given_c(shot.drag) * (1.0 + 1e-14));
    }

    #[test]
    fn what_a_thinner_target_stops_a_thicker_one_stops(shot in shots(), part in 0.01..3.0f64, more in 1.0..10.0f64) {
        let thin = solve(&shot.problem(part * shot.reach()));
        let thick = solve(&shot.problem(more * part * shot.reach()));
        prop_assert!(!(thin.outcome.is_stop() && thick.outcome == Outcome::Perforated));
    }

    #[test]
    fn exit_energy_is_affine_in_the_impact_energy(shot in shots(), part in 0.01..3.0f64, a in 0.1..1.0f64, b in 1.0..4.0f64) {
        let exit = part * shot.reach();
        let energy = |factor: f64| {
            let problem = Shot { speed: shot.speed * factor, ..shot }.problem(exit);
            let margin = Energy::new().exit_margin(&problem).unwrap().unwrap().value;
            margin * factor * factor
        };
        let (wa, w1, wb) = (energy(a), energy(1.0), energy(b));
        let straight = wa + (wb - wa) * (1.0 - a * a) / (b * b - a * a);
        let size = wa.abs() + w1.abs() + wb.abs() + b * b;
        prop_assert!((straight - w1).abs() <= 1e-13 * size / (b * b - a * a).min(1.0), "{straight} {w1}");
    }

    #[test]
    fn residual_energy_through_two_targets_is_that_through_both(shot in shots(), part in 0.1..0.9f64, split in 0.1..0.9f64) {
        let exit = part * shot.reach();
        let whole = shot.problem(exit);
        let through = solve(&whole);
        let first = solve(&Problem { exit_depth: split * exit, ..whole.clone() });
        prop_assert_eq!(first.outcome, Outcome::Perforated);
        // The second target: the same laws with depth counted from its face.
        let face = split * exit;
        let stages: Stages = whole
            .stages
            .iter()
            .filter(|s| s.end > face)
            .map(|s| Stage { static_force: s.static_force + s.stiffness * face, end: s.end - face, ..*s })
            .collect();
        let second = Problem::of_stages(shot.mass, first.end.velocity, stages).with_exit(exit - face);
        let second = solve(&second);
        let energy = |v: f64| (v / shot.speed) * (v / shot.speed);
        prop_assert!((energy(second.end.velocity) - energy(through.end.velocity)).abs() <= 1e-13);
        prop_assert!(((first.end.time + second.end.time) / through.end.time - 1.0).abs() <= 1e-7);
    }
}
