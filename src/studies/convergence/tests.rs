#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
use super::*;
use crate::integrators::{Boundaries, VelocityAt};
use crate::testing::shipped;

fn parsed(text: &str) -> Scene {
    Scene::from_toml(text, "case").unwrap()
}

/// The study of `scene` by this variant over `range`, else over the default one.
fn studied(scene: &Scene, variant: (VelocityAt, Boundaries), range: Option<[f64; 2]>) -> Convergence {
    let problem = scene.problem().unwrap();
    let exact = Truth::of(&problem).unwrap().flight;
    let scheme = |size| CentralDifference::uniform(size, variant.0, variant.1);
    let study = FixedSteps { scheme: &scheme, range, points: 60, seed: 1, with_critical: true, progress: &|_, _| {} };
    of_fixed_steps(scene, &problem, &exact, &study).unwrap()
}

/// A heavy projectile on a long path of `static_force` 1e5 N + 1e6 N/m x, with `second` from 50 mm on.
fn two_stages(second: &str) -> Scene {
    parsed(&format!(
        "projectile.mass = 2\nimpact.velocity = 300\n\
         [[stage]]\nstatic_force = 1e5\nstiffness = 1e6\nend = 0.05\n[[stage]]\nstiffness = 1e6\n{second}"
    ))
}

const PAPER: (VelocityAt, Boundaries) = (VelocityAt::LaggedHalfStep, Boundaries::StepEnd);

#[test]
fn the_right_order_passes_where_the_range_shows_another_power() {
    use Boundaries::{Interpolated, Landed};
    use VelocityAt::{Centred, LaggedHalfStep};
    let weak_drag = two_stages("static_force = 1e5\ndrag = 1e-5");
    let weak_jump = two_stages("static_force = 100010.0");
    let concrete = parsed(
        "[projectile]\nmass = 27.317514010117804\ndiameter = 0.08070826937180187\nnose = { factor = 0.3 }\n\
         [target]\nstrength = 38411806.8394685\ndensity = 1200.0\nthickness = 0.37151141428398393\n\
         [resistance]\nk = 0.707\n[impact]\nvelocity = 104.8747634746812",
    );
    // At rest after 100.314 steps of T/100, an event would fall on the end of a step of T/100 itself.
    let crater = Scene { velocity: Some(54.0), ..shipped("crater") };
    for (name, scene, variant) in [
        ("weak drag", &weak_drag, (LaggedHalfStep, Landed)),
        ("small jump", &weak_jump, (Centred, Interpolated)),
        ("bent range", &concrete, (LaggedHalfStep, Interpolated)),
        ("bent range", &concrete, PAPER),
        ("rest at a step's end", &crater, PAPER),
    ] {
        for study in studied(scene, variant, None).quantities {
            assert_eq!(study.verdict, Verdict::Passed, "{name}, {}: {}", study.quantity, study.reason);
        }
    }
}

#[test]
fn steps_longer_than_the_motion_or_a_stage_are_undecided_and_the_reason_names_a_range() {
    let tunnel = shipped("tunnel");
    let landed = (VelocityAt::Centred, Boundaries::Landed);
    for (variant, range) in [(PAPER, [1e-3, 1e-2]), (landed, [1e-4, 3e-4])] {
        for study in studied(&tunnel, variant, Some(range)).quantities {
            assert_eq!(study.verdict, Verdict::Undecided, "{}: {}", study.quantity, study.reason);
            assert!(study.reason.contains("too long for the motion; try --dt"), "{}", study.reason);
        }
    }
}

#[test]
fn stages_shorter_than_every_step_of_the_first_range_do_not_fail() {
    // 3.5 ms in three stages, then 500 s: steps of 5 ms and more see none of the three.
    let scene = parsed(
        "projectile.mass = 5\nimpact.velocity = 20\n[[stage]]\nstatic_force = 100\nend = 0.02\n\
         [[stage]]\nviscosity = 30\nend = 0.05\n[[stage]]\ndrag = 0.7\nend = 0.07\n[[stage]]\nstatic_force = 0.2",
    );
    for study in studied(&scene, (VelocityAt::Centred, Boundaries::Landed), None).quantities {
        assert_eq!(study.verdict, Verdict::Passed, "{}: {}", study.quantity, study.reason);
    }
    let problem = scene.problem().unwrap();
    let exact = Truth::of(&problem).unwrap().flight;
    let range = Some(STEPS_OVER_TIME.map(|share| share * exact.end.time));
    for study in studied(&scene, (VelocityAt::Centred, Boundaries::Landed), range).quantities {
        assert_eq!(study.verdict, Verdict::Undecided, "{}", study.quantity);
    }
}

#[test]
fn a_critical_velocity_far_from_the_impact_velocity_has_steps_of_its_own_motion() {
    let nearly_free = parsed(
        "[projectile]\nmass = 100\ndiameter = 0.05\nnose = { shape = 'flat' }\n\
         [target]\nstrength = 30e6\ndensity = 2300\nthickness = 0.02\n[impact]\nvelocity = 900",
    );
    // V_c is 56 times the impact velocity.
    let far_above = parsed(
        "projectile.mass = 5.761\ntarget.thickness = 0.3867\nimpact.velocity = 117.3\n\
         [[stage]]\nstatic_force = 90910\nstiffness = 4516000\ndrag = 54.38",
    );
    for scene in [nearly_free, far_above] {
        for study in studied(&scene, PAPER, None).quantities {
            assert_eq!(study.verdict, Verdict::Passed, "{}: {}", study.quantity, study.reason);
            // The work allowed may be spent before the last runs, and no run fails.
            assert!(study.lost < 20, "{}: {} lost", study.quantity, study.lost);
        }
    }
}

#[test]
fn a_run_that_fails_costs_its_point_and_not_the_study() {
    // One step of a second is far beyond the stability of this drag: V_c at that step is out of range.
    let far_above = parsed(
        "projectile.mass = 5.761\ntarget.thickness = 0.3867\nimpact.velocity = 117.3\n\
         [[stage]]\nstatic_force = 90910\nstiffness = 4516000\ndrag = 54.38",
    );
    let studies = studied(&far_above, PAPER, Some([1e-7, 1e-2])).quantities;
    let critical = studies.last().unwrap();
    assert!(critical.quantity == Quantity::CriticalVelocity && critical.lost > 0, "{} lost", critical.lost);
    assert!(studies.iter().any(|study| study.verdict == Verdict::Passed));
    // The search for V_c at a long step ends at speeds whose squares leave the range of numbers.
    let slab = parsed(
        "[projectile]\nmass = 46.3326\ndiameter = 0.195399\nnose = { shape = 'flat' }\n\
         [target]\nstrength = 5.92854e+07\ndensity = 2634\nthickness = 2.66243\n[resistance]\nk = 1.555\n\
         [impact]\nvelocity = 74.6075",
    );
    let studies = studied(&slab, (VelocityAt::LaggedHalfStep, Boundaries::Interpolated), None).quantities;
    assert!(studies.iter().any(|study| study.quantity == Quantity::CriticalVelocity), "{studies:?}");
}

#[test]
fn a_scheme_of_a_lower_order_than_the_formal_one_fails() {
    // Lagged runs under the name of a rule of second order.
    let scene = shipped("tunnel");
    let problem = scene.problem().unwrap();
    let exact = Truth::of(&problem).unwrap().flight;
    let of = |velocity| move |size| CentralDifference::uniform(size, velocity, Boundaries::Landed);
    let (lagged, scheme) = (of(VelocityAt::LaggedHalfStep), of(VelocityAt::Centred));
    let quantities = [Quantity::Depth, Quantity::Time];
    let run = |size, _| {
        let flight = lagged(size).solve_in(&problem, Detail::Events).unwrap();
        let sample = |quantity| {
            let error = flight_error(quantity, &flight, &exact, problem.impact_speed)?;
            Some(Sample { point: StepError::new(size, error), inside: resolves(size, &flight, &exact, quantity) })
        };
        Ok((quantities.map(sample).to_vec(), flight.cost.steps))
    };
    let against = |quantity| Against::of_flight(quantity, &exact, problem.impact_speed);
    let path = Path::of(&problem, &exact);
    let motion = Motion { quantities: &quantities, against: &against, exact: &exact, path, run: &run };
    let runs = Runs { counts: Cell::default(), progress: &|_, _| {} };
    for range in [None, Some(STEPS_OVER_TIME.map(|share| share * exact.end.time))] {
        let study =
            FixedSteps { scheme: &scheme, range, points: 60, seed: 1, with_critical: false, progress: &|_, _| {} };
        for study in motion.study(&study, &runs).unwrap() {
            assert_eq!((study.formal, study.verdict), (Some(2.0), Verdict::Failed), "{}", study.reason);
        }
    }
}

/// The last steps of an explicit code grow as V falls, and lower the orders at rest; orders measured in all variants.
#[test]
fn steps_that_grow_towards_rest_have_the_orders_that_theory_gives_them() {
    let power = "projectile.mass = 2\nimpact.velocity = 300\n[parameters]\nP = '100 kN'\nA = '200 kN'\nv1 = '100 m/s'\n\
                 [[stage]]\nforce = 'P + A*(V/v1)^1.5'\n";
    for (scene, n) in [(shipped("tunnel"), 2.0), (parsed(power), 1.5)] {
        let problem = scene.problem().unwrap();
        let exact = Truth::of(&problem).unwrap().flight;
        for boundaries in Boundaries::ALL {
            let automatic = |safety| CentralDifference {
                steps: Steps::Automatic(safety),
                ..CentralDifference::uniform(1.0, VelocityAt::Centred, boundaries)
            };
            let whole = automatic(1.0).time_step(&problem);
            let scheme = |size| automatic(size / whole);
            // Fine enough for the powers of the last step to stand above those of the steps before.
            let (range, points) = (Some([2e-6, 2e-4].map(|share| share * exact.end.time)), 120);
            let study =
                FixedSteps { scheme: &scheme, range, points, seed: 1, with_critical: false, progress: &|_, _| {} };
            let study = of_fixed_steps(&scene, &problem, &exact, &study).unwrap();
            let [depth, time] = [Quantity::Depth, Quantity::Time]
                .map(|wanted| study.quantities.iter().find(|study| study.quantity == wanted).unwrap());
            let late = boundaries == Boundaries::StepEnd;
            let of_depth = if late { 2.0 / n } else { 2.0 };
            assert!((depth.formal.unwrap() - of_depth).abs() < 1e-3, "{:?}", depth.formal);
            let expected = if late { 1.0 / n } else { 1.0 + 1.0 / n };
            assert!((time.formal.unwrap() - expected).abs() < 1e-3, "{:?}", time.formal);
            for study in [depth, time] {
                assert_ne!(study.verdict, Verdict::Failed, "{n} {boundaries} {}: {}", study.quantity, study.reason);
                let line = study.fit.as_ref().unwrap().line.unwrap();
                let off = (line.order - study.formal.unwrap()).abs();
                assert!(off < 0.2, "{n} {boundaries} {}: {}", study.quantity, line.order);
            }
        }
    }
}
