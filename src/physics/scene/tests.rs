use approx::assert_relative_eq;

use super::*;
use crate::physics::force_table::Row;
use crate::physics::parameter::ParameterError;
use crate::testing::{concrete, scene, stage};

fn scene_of(concrete: Concrete) -> Scene {
    Scene { velocity: Some(277.0), ..Scene::of_concrete(0.906, concrete) }
}

fn stages_scene(stages: Vec<Stage>) -> Scene {
    Scene { resistance: Resistance::Stages(stages), ..scene() }
}

fn layered(thicknesses: &[f64]) -> Scene {
    let layers = thicknesses
        .iter()
        .enumerate()
        .map(|(i, &thickness)| Layer {
            thickness,
            strength: 30e6 + 1e6 * i as f64,
            density: 2000.0 + 100.0 * i as f64,
            static_factor: 12.0,
            follows_eq14: false,
            viscosity: i as f64,
        })
        .collect();
    let thickness = Some(thicknesses.iter().sum::<f64>()).filter(|sum| sum.is_finite());
    Scene { thickness, ..scene_of(Concrete { layers, ..concrete() }) }
}

/// A slab of 0.3 m that plugs.
fn plugging() -> Scene {
    let plug = Some(Plug { half_angle: 60.0, shear_strength: 7.2e6 });
    Scene { plug, thickness: Some(0.3), criterion: Criterion::Plug, ..scene() }
}

/// 2 kg, and stages as a scene file has them.
fn read(text: &str) -> Scene {
    Scene::from_toml(&format!("projectile.mass = 2\nimpact.velocity = 100\n{text}"), "stages").unwrap()
}

fn table(rows: &[(f64, f64)]) -> Force {
    let rows: Vec<_> = rows.iter().map(|&(at, force)| Row { at, force }).collect();
    Force::Table(ForceTable::new(&rows).unwrap())
}

fn layer_force(strength: f64) -> f64 {
    std::f64::consts::FRAC_PI_4 * 0.0269 * 0.0269 * 12.0 * strength
}

#[test]
fn a_problem_at_another_speed_is_the_one_resolved_there_bit_by_bit() {
    let given = scene_of(Concrete { crater_stiffness: CraterStiffness::Given(1e7), ..concrete() });
    let no_crater = scene_of(Concrete { crater_ratio: 0.0, ..concrete() });
    for scene in [scene(), given, no_crater, layered(&[0.01, 0.1, 0.2])] {
        let probe = scene.resolve(1.0).unwrap();
        for speed in [0.0, 1e-3, 277.0, 1e9] {
            assert_eq!(scene.resolve_from(&probe, speed), scene.resolve(speed));
        }
        assert!(scene.resolve_from(&probe, f64::NAN).is_err() && scene.resolve_from(&probe, -1.0).is_err());
    }
    // Its stages have laws, and NaN for coefficients.
    let probe = plugging().resolve(1.0).unwrap();
    assert_eq!(plugging().resolve_from(&probe, 277.0).unwrap().laws, plugging().resolve(277.0).unwrap().laws);
}

#[test]
fn concrete_resolves_into_crater_and_tunnel_with_force_continuous_at_the_crater_end() {
    let problem = scene().problem().unwrap();
    let [crater, tunnel] = problem.stages[..] else { panic!("{problem:?}") };
    assert_eq!((problem.crater, problem.target), (Some(0), Target::CraterAndTunnel));
    assert_eq!((crater.end, tunnel.end, problem.exit_depth), (0.0538, f64::INFINITY, f64::INFINITY));
    // Energy over the crater: M V1² = M V0² - c (k d)².
    let v1 = (277.0_f64.powi(2) - crater.stiffness * 0.0538 * 0.0538 / 0.906).sqrt();
    assert_relative_eq!(crater.force(0.0538, v1), tunnel.force(0.0538, v1), max_relative = 1e-15);
    assert_relative_eq!(tunnel.static_force, layer_force(35.2e6), max_relative = 5e-16);
    assert_eq!(scene().tunnel().unwrap().static_force, tunnel.static_force);
    assert_eq!(scene().tunnel().unwrap().drag, tunnel.drag);
}

#[test]
fn coefficients_lie_within_5_ulp_of_50_digits() {
    // P, Q and c of the same f64 inputs in 60-digit decimal arithmetic.
    let problem = scene().problem().unwrap();
    let ulps = |value: f64, exact: f64| ((value - exact) / (exact.next_up() - exact)).abs();
    assert!(ulps(problem.stages[1].static_force, 240_059.198_022_770_06) <= 5.0);
    assert!(ulps(problem.stages[1].drag, 0.210_456_727_669_997_7) <= 5.0);
    assert!(ulps(problem.stages[0].stiffness, 4_703_437.705_863_008) <= 5.0);
}

#[test]
fn continuous_crater_holds_for_a_stop_inside_it_and_depends_on_the_impact_speed() {
    // Li & Chen (2003), Eq. 15a at I -> 0: X/d = sqrt(4 k I/pi (1 + k pi/(4N))).
    let slow = scene().resolve(1e-6).unwrap();
    let fast = scene().resolve(300.0).unwrap();
    assert!(slow.stages[0].stiffness < fast.stages[0].stiffness);
    let (p, q) = (slow.stages[1].static_force, slow.stages[1].drag);
    assert_relative_eq!(slow.stages[0].stiffness, p / 0.0538 / (1.0 + 0.0538 * q / 0.906), max_relative = 1e-14);
}

#[test]
fn a_crater_of_no_depth_is_left_out_and_a_given_stiffness_is_taken_as_it_is() {
    let problem = scene_of(Concrete { crater_ratio: 0.0, ..concrete() }).problem().unwrap();
    assert_eq!((problem.stages.len(), problem.crater), (1, None));
    let crater_stiffness = CraterStiffness::Given(8.48e6);
    let problem = scene_of(Concrete { crater_stiffness, ..concrete() }).problem().unwrap();
    assert_eq!(problem.stages[0].stiffness, 8.48e6);
}

#[test]
fn layers_become_stages_from_the_one_that_holds_the_crater_end() {
    let open = f64::INFINITY;
    for (thicknesses, ends, exit_depth, strength) in [
        // k d = 53.8 mm lies in the third layer, 40 to 140 mm: ends before it are no boundaries.
        (&[0.01, 0.03, 0.1, 0.2][..], &[0.0538, 0.14, open][..], 0.34, 32e6),
        // A layer that ends there does not hold it.
        (&[0.0538, 0.1], &[0.0538, open], 0.1538, 31e6),
        // A target thinner than the crater is continued by its last layer.
        (&[0.01, 0.02], &[0.0538, open], 0.03, 31e6),
    ] {
        let problem = layered(thicknesses).problem().unwrap();
        assert_eq!((problem.crater, problem.target), (Some(0), Target::Stages));
        assert_eq!(problem.stages.iter().map(|s| s.end).collect::<Vec<_>>(), ends);
        assert_relative_eq!(problem.exit_depth, exit_depth, max_relative = 1e-15);
        assert_relative_eq!(problem.stages[1].static_force, layer_force(strength), max_relative = 1e-15);
    }
    let problem = layered(&[0.01, 0.03, 0.1, 0.2]).problem().unwrap();
    assert_eq!(problem.stages[1].viscosity, 2.0);
    let homogeneous = Concrete { strength: 32e6, density: 2200.0, ..concrete() };
    let stiffness = scene_of(homogeneous).problem().unwrap().stages[0].stiffness;
    assert_eq!(problem.stages[0].stiffness, stiffness);
}

/// The crater ends in the middle layer, which gives it the force at speed zero, and with drag that at any speed.
#[test]
fn a_layer_without_strength_or_without_static_factor_is_an_air_gap() {
    for (strength, static_factor, density) in
        [(0.0, 12.0, 2300.0), (30e6, 0.0, 2300.0), (0.0, 0.0, 2300.0), (0.0, 0.0, 0.0)]
    {
        let mut scene = layered(&[0.04, 0.1, f64::INFINITY]);
        let Resistance::Concrete(concrete) = &mut scene.resistance else { unreachable!() };
        concrete.layers[1] = Layer { strength, static_factor, density, viscosity: 0.0, ..concrete.layers[1] };
        let [still, moving] = [0.0, 1.0].map(|speed| scene.resolve(speed).unwrap());
        assert_eq!((still.stages[0].stiffness, still.stages[1].static_force), (0.0, 0.0));
        assert_eq!(moving.stages[0].stiffness > 0.0, density > 0.0, "{density}");
        assert_eq!(moving.stages[1].force(0.1, 300.0) > 0.0, density > 0.0, "{density}");
        assert!(moving.stages[2].static_force > 0.0 && !moving.has_exit());
    }
}

#[test]
fn a_nose_factor_inertia_factor_or_density_of_0_gives_no_drag() {
    for frictionless in [
        Concrete { nose_factor: 0.0, ..concrete() },
        Concrete { inertia_factor: 0.0, ..concrete() },
        Concrete { density: 0.0, ..concrete() },
    ] {
        assert_eq!(scene_of(frictionless).tunnel().unwrap().drag, 0.0);
    }
}

#[test]
fn layers_that_do_not_sum_up_are_refused() {
    let scene = Scene { thickness: Some(1.0), ..layered(&[0.1, 0.2]) };
    assert!(matches!(scene.problem(), Err(ResolveError::LayersDoNotSumUp { thickness: 1.0, .. })));
    assert!(matches!(
        layered(&[0.1, f64::INFINITY, 0.2]).problem(),
        Err(ResolveError::Inadmissible { parameter: Parameter::Layer(1, LayerNumber::Thickness), .. })
    ));
}

#[test]
fn stages_given_directly_stay_as_they_are_unless_their_ends_fall_or_leave_the_target_open() {
    let at = |end: f64| Stage { end, ..Stage::tunnel(-10.0, 0.5) };
    let stages = vec![at(0.4), at(0.4), Stage::tunnel(5.0, 0.0)];
    let problem = stages_scene(stages.clone()).problem().unwrap();
    assert_eq!((problem.stages.to_vec(), problem.crater, problem.target), (stages, None, Target::Stages));
    assert_eq!(stages_scene(vec![at(0.4)]).problem(), Err(ResolveError::TargetGoesOn(0.4)));
    let ending = Scene { thickness: Some(0.4), ..stages_scene(vec![at(0.4)]) };
    assert_eq!(ending.problem().unwrap().stages[0].end, f64::INFINITY);
    for ends in [[0.4, 0.3, f64::INFINITY], [0.4, f64::INFINITY, f64::INFINITY], [0.4, f64::NAN, f64::INFINITY]] {
        let refused = stages_scene(ends.map(at).to_vec()).problem();
        assert!(matches!(refused, Err(ResolveError::StageEndsFall { .. })), "{ends:?}: {refused:?}");
    }
    assert_eq!(stages_scene(Vec::new()).problem(), Err(ResolveError::NoStage));
}

#[test]
fn ndrc_ends_the_flight_at_the_perforating_depth() {
    let slab = Scene { thickness: Some(0.269), criterion: Criterion::Ndrc, ..scene() };
    assert_relative_eq!(slab.exit_depth_in(&plain).unwrap(), 0.0269 * 7.0, max_relative = 1e-15);
    assert_eq!(slab.exit_depth_warning(), None);
    let thick = Scene { thickness: Some(0.538), ..slab.clone() };
    assert!(thick.exit_depth_warning().unwrap().contains("18.06"));
    let open = Scene { thickness: None, ..slab.clone() };
    assert_eq!(open.exit_depth_in(&plain), Ok(f64::INFINITY));
    let of_diameter = |diameter: f64, thickness: f64| {
        let scene = scene_of(Concrete { diameter, ..concrete() });
        Scene { thickness: Some(thickness), criterion: Criterion::Ndrc, ..scene }.exit_depth_in(&plain)
    };
    assert!(matches!(of_diameter(0.0, 0.269), Err(ResolveError::Inadmissible { .. })));
    assert_eq!(of_diameter(0.0269, 0.0), Ok(0.0));
    // x_p = H/3.19 there, and f64 keeps its digits down to 2.3e-308.
    assert_relative_eq!(of_diameter(0.0269, 7.2e-308).unwrap(), 7.2e-308 / 3.19, max_relative = 1e-15);
    for (diameter, thickness) in [(0.0269, 7e-308), (1e-100, 1e300)] {
        assert!(matches!(of_diameter(diameter, thickness), Err(ResolveError::OutOfRange { .. })), "{thickness:e}");
    }
    let stages = Scene { resistance: Resistance::Stages(vec![Stage::tunnel(1.0, 0.0)]), ..slab };
    assert_eq!(stages.exit_depth_in(&plain), Err(ResolveError::NoDiameter));
}

#[test]
fn coefficients_beyond_the_range_of_numbers_are_refused_with_their_name() {
    let refused = |concrete: Concrete, speed: f64| match scene_of(concrete).resolve(speed) {
        Err(error @ ResolveError::OutOfRange { quantity, .. }) => {
            assert!(!error.is_usage());
            quantity
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(concrete(), 1e160), "the crater stiffness c [N/m]");
    assert_eq!(refused(Concrete { diameter: 1e-180, ..concrete() }, 1.0), "the static force P [N]");
    assert_eq!(refused(Concrete { diameter: 1e160, ..concrete() }, 1.0), "the static force P [N]");
    assert_eq!(refused(Concrete { density: 1e-306, ..concrete() }, 1.0), "the drag Q [kg/m]");
    assert_eq!(refused(Concrete { crater_ratio: 1e-307, ..concrete() }, 1.0), "the crater depth k d [m]");
    assert_eq!(refused(Concrete { crater_ratio: 1e-323, ..concrete() }, 1.0), "the crater depth k d [m]");
    assert!(Concrete::usual_static_factor(-1.0).is_err() && Concrete::usual_static_factor(36e6).is_ok());
}

#[test]
fn inadmissible_numbers_never_reach_a_problem() {
    let given = Concrete { crater_stiffness: CraterStiffness::Given(8e6), ..concrete() };
    let stages = stages_scene(vec![stage(1.0, 1.0, 1.0, 1.0, 0.5), Stage::tunnel(5.0, 0.0)]);
    for scene in [Scene { thickness: Some(1.0), ..scene_of(given) }, layered(&[0.2, 0.1]), stages] {
        assert!(scene.problem().is_ok());
        for parameter in Parameter::all_of(&scene) {
            // Ends of stages, and a last layer without an end, have rules of their own.
            let is_length = matches!(
                parameter,
                Parameter::Stage(_, StageNumber::End) | Parameter::Layer(_, LayerNumber::Thickness)
            );
            let values: &[f64] = if is_length { &[f64::NAN, -1.0] } else { &[f64::NAN, f64::INFINITY, -1.0, 0.0, 1.5] };
            for value in values.iter().filter(|value| !parameter.entry().range.contains(**value)) {
                let mut faulty = scene.clone();
                parameter.set(&mut faulty, *value).unwrap();
                let refused = faulty.problem();
                let ends_fall = matches!(refused, Err(ResolveError::StageEndsFall { .. }));
                let refuses = matches!(refused, Err(ResolveError::Inadmissible { .. })) || (is_length && ends_fall);
                assert!(refuses, "{parameter} = {value}: {refused:?}");
            }
        }
    }
    let no_speed = Scene { velocity: None, ..scene() };
    assert_eq!(no_speed.problem(), Err(ResolveError::NoImpactSpeed));
    assert_eq!(Scene { velocity: Some(3.0), ..no_speed }.problem().unwrap().impact_speed, 3.0);
}

#[test]
fn a_plug_needs_a_thickness_one_medium_and_an_angle_and_a_strength_that_it_may_have() {
    let open = Scene { thickness: None, ..plugging() };
    let in_layers = Scene { plug: plugging().plug, criterion: Criterion::Plug, ..layered(&[0.1, 0.2]) };
    for scene in [open, in_layers, Scene { plug: None, ..plugging() }] {
        assert_eq!(scene.problem(), Err(ResolveError::NoPlug));
    }
    for (parameter, value) in [(Parameter::HalfAngle, 90.0), (Parameter::ShearStrength, 0.0)] {
        let mut scene = plugging();
        parameter.set(&mut scene, value).unwrap();
        assert_eq!(scene.problem(), Err(ResolveError::Inadmissible { parameter, value }));
    }
    let mut cylinder = plugging();
    Parameter::HalfAngle.set(&mut cylinder, 0.0).unwrap();
    assert!(cylinder.problem().is_ok());
}

#[test]
fn the_other_criteria_of_a_plug_end_at_the_thickness_and_that_without_the_static_plug() {
    let (scene, tunnel) = (plugging(), plugging().tunnel().unwrap());
    let left = scene.plug.unwrap().static_thickness(tunnel.static_force, 0.0269);
    let others = scene.other_criteria();
    let thicknesses: Vec<_> = others.iter().map(|(_, other)| other.thickness.unwrap()).collect();
    assert!(left > 0.0 && left < 0.3, "{left}");
    assert_eq!(thicknesses, [0.3, 0.3, 0.3 - left]);
    // A static plug longer than the slab leaves nothing to go through.
    let thin = Scene { thickness: Some(0.5 * left), ..plugging() };
    assert_eq!(thin.other_criteria()[2].1.thickness, Some(0.0));
}

#[test]
fn an_expression_of_four_coefficients_is_a_stage_if_it_brings_to_rest_and_else_a_law() {
    for (force, is_stage) in
        [("P", true), ("R*x", true), ("P + Q*V^2", true), ("W*V", false), ("Q*V^2", false), ("P - Q*V^2", false)]
    {
        let used = [("P", "'1 kN'"), ("R", "'1 kN/m'"), ("W", "'1 kg/s'"), ("Q", "'1 kg/m'")];
        let used = used.iter().filter(|(name, _)| force.contains(name)).map(|(name, is)| format!("{name} = {is}\n"));
        let text = format!("[parameters]\n{}[[stage]]\nforce = '{force}'\n", used.collect::<String>());
        assert_eq!(read(&text).problem().unwrap().laws.is_empty(), is_stage, "{force}");
    }
}

#[test]
fn a_law_stands_at_its_own_stage_behind_one_of_coefficients() {
    let text = "[parameters]\nP = '1 kN'\nv = '1 m/s'\n[[stage]]\nstatic_force = 5\nend = 0.1\n\
                [[stage]]\nforce = 'P*exp(V/v)'\n";
    let problem = read(text).problem().unwrap();
    assert!(problem.laws.of(0).is_none() && problem.laws.of(1).is_some());
    assert_eq!(problem.stages[0].static_force, 5.0);
    // An end on a condition makes a law of every stage.
    let ending =
        read("[[stage]]\nstatic_force = 5\nend_velocity = 9\n[[stage]]\nstatic_force = 6\n").problem().unwrap();
    for (index, stage) in ending.stages.iter().enumerate() {
        assert!(ending.laws.of(index).is_some() && stage.static_force.is_nan(), "{stage:?}");
    }
}

#[test]
fn numbers_of_ends_and_stages_that_are_no_numbers_of_theirs_are_refused() {
    let text = "[[stage]]\nstatic_force = 5\nend_velocity = 9\nadd_mass = 0.5\n[[stage]]\nstatic_force = 6\n";
    for (which, given) in [(StageNumber::EndVelocity, 9.0), (StageNumber::AddMass, 0.5)] {
        let (mut scene, parameter) = (read(text), Parameter::Stage(0, which));
        assert_eq!(parameter.get(&scene), Ok(given));
        assert!(Parameter::all_of(&scene).contains(&parameter));
        assert!(matches!(Parameter::Stage(1, which).get(&scene), Err(ParameterError::Absent { .. })));
        parameter.set(&mut scene, -1.0).unwrap();
        assert_eq!(scene.problem(), Err(ResolveError::Inadmissible { parameter, value: -1.0 }));
    }
    let last = Scene { resistance: Resistance::Stages(vec![Stage::tunnel(5.0, 0.0)]), ..read(text) };
    assert_eq!(last.problem(), Err(ResolveError::NothingFollows(0)));
    let mut falls = read(&format!("{text}end = 0.4\n[[stage]]\nstatic_force = 7\n"));
    falls.ends = vec![(1, falls.ends[0].1.clone())];
    let Resistance::Stages(stages) = &mut falls.resistance else { unreachable!() };
    stages[0].end = 0.5;
    assert!(matches!(falls.problem(), Err(ResolveError::StageEndsFall { stage: 1, .. })), "{:?}", falls.problem());
    let subnormal = stages_scene(vec![Stage::tunnel(1e-310, 0.0)]).problem();
    assert!(matches!(subnormal, Err(ResolveError::OutOfRange { .. })), "{subnormal:?}");
}

/// Stages of 1 N and of a table to 0.2 m, the table's number of pieces, and whose law the mass joins.
#[test]
fn what_follows_a_table_of_depth_stands_behind_its_pieces() {
    let rows = [(0.0, 9.0), (0.05, 8.0), (0.1, 7.0), (0.2, 6.0)];
    let given = |ends: &[f64], at: usize| {
        let stages = ends.iter().map(|&end| Stage { end, ..Stage::tunnel(1.0, 0.0) }).collect();
        Scene { forces: vec![(at, table(&rows))], ..stages_scene(stages) }
    };
    let open = f64::INFINITY;
    // The table ends with its stage or behind it, and a stage of no length has none of its pieces.
    for (ends, at, resolved) in [
        (&[0.2, open][..], 0, &[0.05, 0.1, 0.2, open][..]),
        (&[0.1, open], 0, &[0.05, 0.1, open]),
        (&[0.1, 0.1, open], 1, &[0.1, 0.1, open]),
    ] {
        let mut scene = given(ends, at);
        let problem = scene.problem().unwrap();
        assert_eq!(problem.stages.iter().map(|stage| stage.end).collect::<Vec<_>>(), resolved);
        assert_eq!(problem.target, Target::Stages);
        scene.ends = vec![(at, OwnEnd { condition: None, add_mass: Some(0.5) })];
        let laws = scene.problem().unwrap().laws;
        let joins = |index: usize| laws.of(index).is_some_and(|law| law.joining(0.1).is_some());
        let last = resolved.len() - 1;
        assert_eq!((0..=last).filter(|index| joins(*index)).collect::<Vec<_>>(), [last], "{ends:?}");
    }
    // Another stage's mass, behind a table.
    let mut scene = given(&[0.2, 0.3, open], 0);
    scene.ends = vec![(1, OwnEnd { condition: None, add_mass: Some(0.5) })];
    let laws = scene.problem().unwrap().laws;
    assert!(laws.of(4).unwrap().joining(0.3).is_some() && laws.of(3).unwrap().joining(0.3).is_none());
    // A table has to go on where its stage begins; behind a stage without a depth that is the face.
    assert!(matches!(given(&[0.2, open], 1).problem(), Err(ResolveError::TableElsewhere { stage: 1, .. })));
    let mut scene = given(&[open, open], 1);
    scene.ends = vec![(0, OwnEnd { condition: Some(Ending::Velocity(9.0)), add_mass: None })];
    assert_eq!(scene.problem().unwrap().stages[1].end, 0.05);
}

#[test]
fn a_table_whose_pieces_leave_the_range_of_numbers_is_refused() {
    for (rows, name) in [
        ([(0.0, 0.0), (1e10, 1e-300)], "the stiffness between two rows of a table [N/m]"),
        ([(0.0, 1e-310), (1.0, 1e-310)], "the static force of a piece of a table [N]"),
    ] {
        let scene = Scene { forces: vec![(0, table(&rows))], ..stages_scene(vec![Stage::free()]) };
        match scene.problem() {
            Err(ResolveError::OutOfRange { quantity, .. }) => assert_eq!(quantity, name),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn the_example_of_a_range_lies_in_it() {
    for range in [Range::Finite, Range::NotNegative, Range::Positive, Range::UnitInterval, Range::AtLeastHalf] {
        assert!(range.contains(range.example().parse().unwrap()), "{range:?}");
    }
}

/// Each error as a person sees it: whether it is one of usage, its message and the remedy.
#[test]
fn errors_name_the_numbers_and_the_remedy_and_only_overflow_is_no_usage() {
    let mut shown = String::new();
    for error in [
        ResolveError::Inadmissible { parameter: Parameter::Mass, value: -1.0 },
        ResolveError::NoImpactSpeed,
        ResolveError::NoDiameter,
        ResolveError::NoStage,
        ResolveError::StageEndsFall { stage: 1, end: 0.3, previous: 0.4 },
        ResolveError::TargetGoesOn(0.4),
        ResolveError::LayersDoNotSumUp { sum: 0.3, thickness: 1.0 },
        ResolveError::OutOfRange { quantity: "the drag Q [kg/m]", value: 1e-310 },
    ] {
        shown += &format!("usage: {}\n{error}\n{}\n\n", error.is_usage(), error.help());
    }
    snapbox::assert_data_eq!(shown, snapbox::file!["snapshots/errors.txt"].raw());
}
