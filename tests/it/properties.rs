//! Relations that hold between flights whatever the scene, without any known answer.
#![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]

use approx::assert_relative_eq;
use penetrode::integrators::{Detail, Energy, Flight, Integrator, Taylor};
use penetrode::physics::{Outcome, Problem, Stage, Stages};
use penetrode::studies::relations::{Units, in_units, reversed};
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
    fn other_units_fly_the_same(shot in shots(), l in -6.0..6.0f64, m in -6.0..6.0f64, t in -6.0..6.0f64) {
        let (l, m, t) = (10f64.powf(l), 10f64.powf(m), 10f64.powf(t));
        let problem = shot.problem(f64::INFINITY);
        let (plain, scaled) = (solve(&problem), solve(&in_units(&problem, Units { length: l, mass: m, time: t })));
        assert_relative_eq!(scaled.end.depth / l, plain.end.depth, max_relative = 1e-13);
        assert_relative_eq!(scaled.end.time / t, plain.end.time, max_relative = 1e-13);
    }

    #[test]
    fn mass_and_forces_times_a_factor_leave_the_path(shot in shots(), power in -60..60) {
        let factor = 2f64.powi(power);
        let problem = shot.problem(f64::INFINITY);
        let (plain, scaled) = (solve(&problem), solve(&in_units(&problem, Units { length: 1.0, mass: factor, time: 1.0 })));
        // Powers of two round nothing.
        prop_assert_eq!(plain.end, scaled.end);
        prop_assert_eq!(plain.events, scaled.events);
    }

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
    fn splitting_the_path_and_restarting_changes_nothing(shot in shots(), part in 0.05..0.95f64) {
        let problem = shot.problem(f64::INFINITY);
        let plain = solve(&problem);
        let cut_at = part * plain.end.depth;
        let mut stages = Stages::new();
        for (index, law) in problem.stages.iter().enumerate() {
            if problem.start_of(index) < cut_at && cut_at < law.end {
                stages.push(Stage { end: cut_at, ..*law });
            }
            stages.push(*law);
        }
        let cut = solve(&Problem::of_stages(shot.mass, shot.speed, stages));
        assert_relative_eq!(cut.end.depth, plain.end.depth, max_relative = 1e-13);
        // An event added on the way: the time of rest has no square root to lose digits by, the force being continuous.
        assert_relative_eq!(cut.end.time, plain.end.time, max_relative = 1e-12);
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

    #[test]
    fn flown_back_from_the_exit_it_leaves_the_face_at_the_impact_speed(shot in shots(), part in 0.1..0.9f64) {
        let exit = part * shot.reach();
        let problem = shot.problem(exit);
        let there = solve(&problem);
        let back = solve(&reversed(&problem, &there).unwrap());
        // Going back multiplies what was lost by V0²/V_r².
        let gain = (shot.speed / there.end.velocity).powi(2);
        prop_assert!((back.end.velocity / shot.speed - 1.0).abs() <= 1e-13 * gain, "{}", back.end.velocity);
        prop_assert!((back.end.time / there.end.time - 1.0).abs() <= 1e-13 * gain);
    }

    #[test]
    fn vanishing_drag_is_no_drag(shot in shots(), part in 0.1..2.0f64) {
        let free = Shot { drag: 0.0, ..shot };
        let exit = part * free.reach();
        // Small beside both scales of the drag: its force beside P, and its mass over the crater beside M (in c).
        let scale = (shot.force / (shot.speed * shot.speed)).min(shot.mass / shot.crater);
        let almost = Shot { drag: 1e-18 * scale, ..shot };
        let (a, b) = (solve(&free.problem(exit)), solve(&almost.problem(exit)));
        prop_assume!(a.exit_margin.unwrap().abs() > 1e-12);
        prop_assert_eq!(a.outcome, b.outcome);
        assert_relative_eq!(a.end.depth, b.end.depth, max_relative = 1e-13);
    }
}
