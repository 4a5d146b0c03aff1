//! Contracts of a solution whose force is an expression of its own, for every method that takes one.

use std::sync::Arc;

use twofloat::TwoFloat;

use super::*;
use crate::exchange::scene_file::SceneFile;
use crate::integrators::Enclosure;
use crate::physics::ball::Ball;
use crate::physics::reference::{self, Source};
use crate::physics::{Advice, EventKind, ForceFunction, Law, Outcome, Problem, Scalar, Scene, Stage};
use crate::studies::error::Errors;
use crate::studies::formal_order::{Path, formal_order};
use crate::studies::quantity::Quantity;
use crate::studies::random_problems::Kind;
use crate::testing::{Random, kinds, random_concrete};

/// 2 kg, a force of the parameters below, no far side.
fn scene(force: &str, speed: f64) -> Scene {
    let known = [
        ("P", "'848 kN'"),
        ("Q", "'3.25 kg/m'"),
        ("R", "'50 kN'"),
        ("b", "0.2"),
        ("v1", "'100 m/s'"),
        ("l", "'20 mm'"),
    ];
    let is_used = |name: &str| force.split(|c: char| !c.is_alphanumeric()).any(|word| word == name);
    let used = known.iter().filter(|(name, _)| is_used(name)).map(|(name, value)| format!("{name} = {value}\n"));
    let text = format!(
        "projectile.mass = 2\nimpact.velocity = {speed:?}\n[parameters]\n{}[[stage]]\nforce = \"{force}\"\n",
        used.collect::<String>()
    );
    Scene::from_toml(&text, "law").unwrap()
}

fn problem(force: &str, speed: f64) -> Problem {
    scene(force, speed).problem().unwrap()
}

/// Force, impact speed (m/s), depth (m) and time (s) of rest; and the speed (m/s) at a depth (m) before it.
///
/// Of a force of V alone by quadrature over V, of the others by that over x of the linear equation of W; mpmath with 40
/// digits, 20 for those times.
const KNOWN: [(&str, f64, f64, f64, f64, f64); 14] = [
    (
        "P + Q*V^2 + R*(V/v1)^1.5",
        202.0,
        0.041_204_557_230_173_07,
        0.000_428_546_364_637_818_07,
        0.0247,
        122.553_119_945_732_2,
    ),
    (
        "(P + Q*V^2)*(1 + b*exp(-V/v1))",
        202.0,
        0.042_215_047_140_045_196,
        0.000_417_898_950_212_396_17,
        0.0253,
        126.915_553_950_958_28,
    ),
    (
        "P*(1 + b*log(1 + V/v1)) + Q*V^2",
        202.0,
        0.038_884_348_984_737_79,
        0.000_406_144_033_262_498_3,
        0.0233,
        122.936_787_372_337_65,
    ),
    (
        "P*(1 + b*log10(1 + V/v1))",
        202.0,
        0.044_899_526_408_868_136,
        0.000_451_160_766_195_477_44,
        0.0269,
        126.699_943_769_336_16,
    ),
    ("R*(V/v1)^0.2", 202.0, 0.787_807_210_146_129_1, 0.008_775_080_311_033_617, 0.473, 121.347_761_439_303_35),
    (
        "P + R*sqrt(1 + (V/v1)^2)",
        202.0,
        0.043_732_270_048_354_51,
        0.000_438_214_981_961_115_86,
        0.0262,
        126.619_197_093_779_93,
    ),
    (
        "P*(1 + b*atan(V/v1)) + R*tanh(V/v1)",
        202.0,
        0.039_326_581_287_758_03,
        0.000_405_373_466_922_416_63,
        0.0236,
        124.917_544_266_803_74,
    ),
    (
        "P*(1 + b*sin(V/v1)) + R*cos(V/v1)",
        202.0,
        0.040_607_926_093_901_986,
        0.000_408_310_674_349_731_76,
        0.0244,
        127.355_626_091_266_06,
    ),
    (
        "P + Q*max(V^2 - v1^2, 0)",
        202.0,
        0.046_128_778_267_665_815,
        0.000_464_680_914_642_254_54,
        0.0277,
        125.254_664_130_440_3,
    ),
    (
        "P*tanh(x/l) + Q*V^2 + R",
        202.0,
        0.053_932_395_527_220_63,
        0.000_494_143_976_752_465_9,
        0.0324,
        139.428_766_779_235_53,
    ),
    (
        "P + R*abs(x/l - 1) + Q*V^2",
        202.0,
        0.043_399_285_497_563_48,
        0.000_436_294_037_314_787_1,
        0.026,
        125.861_988_905_239_61,
    ),
    (
        "P*(1 - exp(-x/l)) + Q*V^2 + R",
        202.0,
        0.058_409_514_287_266_776,
        0.000_530_410_558_634_416_4,
        0.035,
        140.517_395_133_519_27,
    ),
    ("P - R*x/l", 202.0, 0.052_122_588_837_087_355, 0.000_531_142_289_585_633_8, 0.0313, 124.443_611_728_364_74),
    ("P*cos(x/l) + R", 150.0, 0.147_668_165_465_075_55, 0.001_476_123_497_302_210_9, 0.0886, 185.359_803_087_063_1),
];

/// Methods that take a law, to round-off or to `rtol`.
pub(super) fn methods(rtol: f64) -> Vec<(MethodName, Method)> {
    let names = MethodName::built().filter(|name| {
        !matches!(name, MethodName::ClosedForm | MethodName::Enclosure) && name.accuracy() != Accuracy::Step
    });
    names
        .map(|name| {
            let is_tolerant = name.accuracy() == Accuracy::Tolerance;
            let options = MethodOptions { rtol: is_tolerant.then_some(rtol), ..MethodOptions::default() };
            (name, Method::new(name, &options).unwrap())
        })
        .collect()
}

/// Whether the method works to round-off: `taylor` and `energy`.
pub(super) fn is_exact(name: MethodName) -> bool {
    name.accuracy() == Accuracy::RoundOff
}

/// The methods to round-off: over time, and over depth.
pub(super) fn exact_methods() -> [Box<dyn Integrator>; 2] {
    [Box::new(Taylor::default()), Box::new(Energy::new())]
}

/// What it lacks to the far side is at least what it lacks to that place.
#[test]
fn a_rest_in_front_of_a_place_where_the_force_has_no_value_is_a_stop() {
    let problem = problem("P*sqrt(1 - x/(40*l)) + R*V/v1", 100.0).with_exit(1.1);
    let flight = Taylor::default().solve(&problem, Detail::Events).unwrap();
    assert_eq!(flight.outcome, Outcome::Stopped);
    // 2/3 of P times 0.8 m, less the energy at impact, over M V0²/2.
    let missing = 1.0 - (2.0 / 3.0) * 848e3 * 0.8 / 1e4;
    let margin = flight.exit_margin.unwrap();
    assert!(margin < 0.9 * missing && margin > 1.1 * missing, "{margin} of {missing}");
}

/// The work from there on has no number: the depths tell. An error grows without bound too where the force rises as a logarithm.
#[test]
fn a_rest_under_a_force_without_bound_there_is_no_passage() {
    for (force, outcomes) in [
        ("P*sqrt(v1/V)*(1 + x/l)", &[Outcome::Stopped][..]),
        ("P*(1 - b*log(V/v1))*(1 + x/l)", &[Outcome::Stopped, Outcome::Undecided]),
    ] {
        let flight = Taylor::default().solve(&problem(force, 100.0).with_exit(1.1), Detail::Events).unwrap();
        assert!(outcomes.contains(&flight.outcome), "{force}: {:?}", flight.outcome);
        assert_eq!(flight.exit_margin, Some(flight.end.depth / 1.1 - 1.0), "{force}");
    }
}

#[test]
fn every_method_solves_every_law_as_accurately_as_it_promises() {
    for (name, method) in methods(1e-10) {
        // Steps that pass a kink, or a power at rest, lose accuracy that the library does not see.
        for (force, speed, depth, time, exit, velocity) in KNOWN {
            let allowed = if is_exact(name) { 8.0 * f64::EPSILON } else { 300.0 * name.promise_at(1e-10) };
            let flight = method.integrator().solve(&problem(force, speed), Detail::Events).unwrap();
            assert_eq!((flight.outcome, kinds(&flight.events)), (Outcome::Stopped, vec![EventKind::Rest]), "{force}");
            let through = problem(force, speed).with_exit(exit);
            let through = method.integrator().solve(&through, Detail::Events).unwrap();
            assert_eq!((through.outcome, through.end.depth), (Outcome::Perforated, exit), "{force}");
            let errors = [flight.end.depth / depth, flight.end.time / time, through.end.velocity / velocity];
            let error = errors.into_iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
            assert!(error <= allowed, "{name}, {force}: {error:e}");
        }
    }
}

/// `P (1 + b ln(1 + V/v1)) + Q V²` in code.
#[derive(Debug)]
struct Rate;

impl ForceFunction for Rate {
    fn force(&self, _x: f64, v: f64) -> f64 {
        848e3 * (1.0 + 0.2 * (1.0 + v / 100.0).ln()) + 3.25 * v * v
    }
}

#[test]
fn a_law_in_code_is_solved_as_the_same_law_in_text() {
    let coded = |speed| Problem::of_stages(2.0, speed, [Stage::free()]).with_law(0, &Law::of_code(Arc::new(Rate)));
    let (_, speed, depth, time, exit, velocity) = KNOWN[2];
    for (name, method) in methods(1e-10) {
        if is_exact(name) {
            let error = method.integrator().solve(&coded(speed), Detail::End).unwrap_err();
            assert!(error.is_usage() && error.to_string().contains("a law in code"), "{error}");
            continue;
        }
        let end = method.integrator().solve(&coded(speed), Detail::End).unwrap().end;
        let through = method.integrator().solve(&coded(speed).with_exit(exit), Detail::End).unwrap().end;
        for (value, exact) in [(end.depth, depth), (end.time, time), (through.velocity, velocity)] {
            assert!((value / exact - 1.0).abs() < 300.0 * name.promise_at(1e-10), "{name}: {value} and {exact}");
        }
        // W at a slab as thick as the depth of rest is zero.
        let resolve = |speed| Ok(coded(speed).with_exit(depth));
        let critical = crate::studies::critical_velocity::critical_velocity(resolve, method.integrator()).unwrap();
        assert!((critical.velocity - speed).abs() <= critical.error_bar.unwrap(), "{name}: {critical:?}");
    }
    let scheme = CentralDifference::uniform(1e-7, VelocityAt::Centred, Boundaries::Interpolated);
    assert!((scheme.solve(&coded(speed), Detail::End).unwrap().end.depth / depth - 1.0).abs() < 1e-6);
}

#[test]
fn a_law_in_code_without_a_value_ends_the_flight_with_an_error() {
    #[derive(Debug)]
    struct Lost;
    impl ForceFunction for Lost {
        fn force(&self, x: f64, _v: f64) -> f64 {
            if x < 0.01 { 1e5 } else { f64::NAN }
        }
    }
    let problem = Problem::of_stages(2.0, 300.0, [Stage::free()]).with_law(0, &Law::of_code(Arc::new(Lost)));
    for (name, method) in methods(1e-8) {
        assert!(method.integrator().solve(&problem, Detail::End).is_err(), "{name}");
    }
    let scheme = CentralDifference::uniform(1e-6, VelocityAt::Centred, Boundaries::Interpolated);
    assert!(scheme.solve(&problem, Detail::End).is_err());
}

#[test]
fn what_is_a_formula_refuses_a_law() {
    let problem = problem("P + R*(V/v1)^1.5", 300.0);
    let error = ClosedForm.solve(&problem, Detail::End).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("a law of its own"), "{error}");
    let error = Energy::new().exit_margin_in(&problem).map(drop).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("a law of its own"), "{error}");
    assert!(reference::flight(Source::Problem(&problem)).is_err());
}

/// The same problem with every stage written as an expression, and solved as one: its coefficients are those that are read.
fn written(problem: &Problem) -> Problem {
    let mut text = format!("projectile.mass = {:e}\nimpact.velocity = {:e}\n", problem.mass, problem.impact_speed);
    if problem.has_exit() {
        text += &format!("target.thickness = {:e}\n", problem.exit_depth);
    }
    let mut stages = String::new();
    text += "[parameters]\n";
    for (index, stage) in problem.stages.iter().enumerate() {
        let Stage { static_force: p, stiffness: s, viscosity: r, drag: q, end } = *stage;
        let units = [("p", p, "N"), ("s", s, "N/m"), ("r", r, "kg/s"), ("q", q, "kg/m")];
        for (name, value, unit) in units {
            text += &format!("{name}{index} = '{value:e} {unit}'\n");
        }
        stages += &format!("[[stage]]\nforce = 'p{index} + s{index}*x + r{index}*V + q{index}*V^2'\n");
        if end.is_finite() {
            stages += &format!("end = {end:e}\n");
        }
    }
    let read = Scene::from_toml(&(text + &stages), "written").unwrap().problem().unwrap();
    for (index, (given, read_one)) in problem.stages.iter().zip(&read.stages).enumerate() {
        let is_one = read.laws.of(index).is_none();
        let rests = given.static_force != 0.0 || given.stiffness != 0.0;
        assert_eq!(is_one, rests && given.stiffness >= 0.0 && given.viscosity >= 0.0 && given.drag >= 0.0);
        assert!(!is_one || given == read_one, "{given:?} {read_one:?}");
    }
    let laws = problem.stages.iter().map(Law::of_coefficients).enumerate();
    laws.fold(read, |problem, (index, law)| problem.with_law(index, &law))
}

/// dX/dP and others through the coefficients: by differences of the flights of stages.
#[test]
fn an_expression_of_the_four_terms_is_their_stage_for_every_method() {
    let stage = |force: &str| {
        let problem = problem(force, 300.0);
        (problem.laws.is_empty(), problem.stages[0])
    };
    let plain = Stage::free();
    for (force, expected) in [
        ("P + Q*V^2", Stage { static_force: 848e3, drag: 3.25, ..plain }),
        ("P*(1 + V/v1)^2", Stage { static_force: 848e3, viscosity: 16960.0, drag: 84.8, ..plain }),
        ("P*x/l + R", Stage { static_force: 50e3, stiffness: 4.24e7, ..plain }),
        ("R*sqrt(4)*max(1, 2) - R*V/v1*(-1)", Stage { static_force: 2e5, viscosity: 500.0, ..plain }),
        ("R + Q*V*(V + v1)", Stage { static_force: 50e3, viscosity: 325.0, drag: 3.25, ..plain }),
        ("-R + P*x/l", Stage { static_force: -50e3, stiffness: 4.24e7, ..plain }),
    ] {
        let (is_one, found) = stage(force);
        let numbers = |of: Stage| [of.static_force, of.stiffness, of.viscosity, of.drag];
        let mut pairs = numbers(found).into_iter().zip(numbers(expected));
        assert!(is_one && pairs.all(|(a, b)| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs()), "{force}: {found:?}");
    }
    // Not: powers and products of other terms, terms that cancel only as numbers, and what no stage may have.
    for force in [
        "P*(V/v1)^3",
        "P*x/l*V/v1",
        "P*(x/l)^2",
        "P*max(1, V/v1)",
        "P + R*(V/v1)^1.5",
        "P - Q*V^2",
        "P - R*x/l",
        "P/(1 + x/l)",
        "Q*V^2",
    ] {
        assert!(!stage(force).0, "{force}");
    }
    let text = "projectile.mass = 2\nimpact.velocity = 300\n[parameters]\nP = '848 kN'\nb = 2\nv1 = '100 m/s'\n\
                [[stage]]\nforce = 'P*(1 + b*(V/v1)^2)'\n";
    let scene = Scene::from_toml(text, "law").unwrap();
    let own = |name: &str| scene.parameters.iter().find(|one| one.name.text() == name).unwrap();
    for name in ["P", "b", "v1"] {
        let which = crate::physics::parameter::Parameter::Own(own(name).name);
        let depth = |factor: f64| {
            let mut moved = scene.clone();
            which.set(&mut moved, factor * own(name).value).unwrap();
            ClosedForm.solve(&moved.problem().unwrap(), Detail::End).unwrap().end.depth
        };
        let by_differences = (depth(1.0001) / depth(0.9999)).ln() / (1.0001_f64 / 0.9999).ln();
        let dual = scene
            .resolve_in(300.0, |parameter, value| {
                num_dual::Dual64::new(value, if parameter == which { value } else { 0.0 })
            })
            .unwrap();
        let end = Taylor::default().solve_in(&dual, Detail::End).unwrap().end.depth;
        assert!((end.eps / end.re - by_differences).abs() < 1e-6, "{name}: {} and {by_differences}", end.eps / end.re);
    }
}

#[test]
fn coefficients_written_as_an_expression_give_the_same_digits() {
    let mut random = Random::new(5);
    for _ in 0..200 {
        let problem = random_concrete(&mut random);
        let (exact, conditions) = (
            reference::flight(Source::Problem(&problem)).unwrap(),
            reference::conditions(Source::Problem(&problem)).unwrap(),
        );
        let flight = Taylor::default().solve(&written(&problem), Detail::Events).unwrap();
        if flight.outcome == Outcome::Undecided {
            continue;
        }
        assert!(flight.outcome.is_stop() == exact.outcome.is_stop(), "{problem:?}");
        // The crater's end is a stage's end here.
        let end = flight.end;
        let renamed =
            Flight { events: Taylor::default().solve(&problem, Detail::Events).unwrap().events, end, ..flight };
        let (units, quantity) = Errors::in_50_digits(&renamed, &exact, &conditions).worst().unwrap();
        assert!(units < 16.0, "{units} of {quantity}: {problem:?}");
    }
}

/// Errors at two steps, one eighth of each other, over many steps: the slope is the order.
#[test]
fn central_difference_has_its_formal_orders_for_a_law() {
    for velocity in VelocityAt::ALL {
        for boundaries in Boundaries::ALL {
            for (force, speed, depth, time, exit, end_speed) in [KNOWN[1], KNOWN[2], KNOWN[11], KNOWN[12]] {
                let solve = |problem: &Problem, step| {
                    CentralDifference::uniform(step, velocity, boundaries).solve(problem, Detail::Events).unwrap()
                };
                let (stop, through) = (problem(force, speed), problem(force, speed).with_exit(exit));
                for (quantity, problem, exact) in [
                    (Quantity::Depth, &stop, depth),
                    (Quantity::Time, &stop, time),
                    (Quantity::Velocity, &through, end_speed),
                ] {
                    let path = Path::of(problem, &Taylor::default().solve(problem, Detail::Events).unwrap());
                    let formal = formal_order(velocity, boundaries, &path, quantity).unwrap();
                    let error = |scale: f64| {
                        let steps = (0..12).map(|i| time / (scale * (200.0 + 7.3 * f64::from(i))));
                        let errors = steps.map(|step| {
                            let end = solve(problem, step).end;
                            let value = match quantity {
                                Quantity::Depth => end.depth,
                                Quantity::Time => end.time,
                                _ => end.velocity,
                            };
                            (value / exact - 1.0).abs()
                        });
                        errors.fold(0.0, f64::max)
                    };
                    let order = (error(1.0) / error(8.0)).log(8.0);
                    let said = format!("{quantity} of {force}, {velocity}, {boundaries}: {order} of {formal}");
                    assert!(order > formal - 0.25 && (formal > 1.5 || order < formal + 0.6), "{said}");
                }
            }
        }
    }
}

/// Force, depth (m) and time (s) of rest from 300 m/s; mpmath, 40 digits: over x `X = l (V0² M (n+1)/(2 P l))^(1/(n+1))` for `P (x/l)^n`
/// and `t = X/V0 B(1/(n+1), 1/2)/(n+1)`; over V `M V0^1.5/(1.5 P √v1)` and the like for `P (V/v1)^-0.5`.
const BRANCHED: [(&str, f64, f64); 4] = [
    ("P*(x/l)^1.5", 0.056_251_312_958_145_08, 0.000_275_938_489_192_318_5),
    ("P*sqrt(x/l)", 0.079_732_480_632_051_06, 0.000_458_392_584_053_963_2),
    ("P + P*sqrt(max(x/l - 0.5, 0))", 0.057_433_268_553_268_87, 0.000_340_397_182_033_063_1),
    ("P*(V/v1)^-0.5", 0.147_060_917_623_772_6, 0.000_817_005_097_909_847_8),
];

#[test]
fn laws_without_a_series_at_their_start_or_without_bound_at_rest_are_solved() {
    for (force, depth, time) in BRANCHED {
        let problem = problem(force, 300.0);
        for (name, method) in methods(1e-10) {
            let allowed = if is_exact(name) { 8.0 * f64::EPSILON } else { 1e4 * name.promise_at(1e-10) };
            let end = method.integrator().solve(&problem, Detail::End).unwrap().end;
            let error = (end.depth / depth - 1.0).abs().max((end.time / time - 1.0).abs());
            assert!(error <= allowed, "{name}, {force}: {error:e}");
        }
        // The default step resolves a force that is nothing at impact.
        if !force.contains('V') {
            let scheme = CentralDifference { velocity: VelocityAt::Centred, ..CentralDifference::default() };
            let end = scheme.solve(&problem, Detail::End).unwrap().end;
            assert!((end.depth / depth - 1.0).abs() < 1e-3, "{force}: {end}");
        }
    }
}

/// A wall of 1 cm, 29 cm behind the face, takes all of the energy: its series at the face is that of nothing.
#[test]
fn a_wall_far_ahead_is_not_stepped_over() {
    for (force, inner) in [
        ("R*0.02 + P*6*exp(-((x/l - 14.5)/0.5)^2)", 0.27..0.325),
        ("R*0.02 + P*24*exp(-((x/l - 14.5)/0.15)^4)", 0.27..0.325),
        ("R*0.02 + P*3*(tanh((x/l - 13)/0.05) - tanh((x/l - 14.5)/0.05))", 0.25..0.325),
    ] {
        let problem = problem(force, 300.0).with_exit(0.33);
        for (name, method) in methods(1e-8) {
            let flight = method.integrator().solve(&problem, Detail::Events).unwrap();
            assert!(flight.outcome.is_stop() && inner.contains(&flight.end.depth), "{name}, {force}: {}", flight.end);
        }
        let resolve = |speed| Ok(Problem { impact_speed: speed, ..problem.clone() });
        // The work of the wall and of the slab.
        let law = problem.laws.of(0).unwrap();
        let exact = (2.0 * law.static_work(0.0, 0.33).1 / 2.0).sqrt();
        for method in exact_methods() {
            let critical = crate::studies::critical_velocity::critical_velocity(resolve, &*method).unwrap();
            assert!((critical.velocity / exact - 1.0).abs() < 1e-9, "{force}: {} and {exact}", critical.velocity);
        }
    }
}

/// `P (1 - x/l)` drives beyond l: `V_c² = P l/M` stands on the barrier.
#[test]
fn a_critical_speed_on_a_barrier_is_found() {
    let problem = problem("P*(1 - x/l)", 100.0).with_exit(0.1);
    let resolve = |speed| Ok(Problem { impact_speed: speed, ..problem.clone() });
    let exact = (848e3_f64 * 0.02 / 2.0).sqrt();
    for method in exact_methods() {
        let critical = crate::studies::critical_velocity::critical_velocity(resolve, &*method).unwrap();
        assert!((critical.velocity / exact - 1.0).abs() < 1e-12, "{} and {exact}", critical.velocity);
        let on_it = method.solve(&resolve(exact).unwrap(), Detail::End).unwrap();
        assert_eq!(on_it.outcome, Outcome::Undecided);
    }
}

#[test]
fn a_force_without_a_value_ends_the_flight_with_its_place_and_the_reason() {
    // The root is of a negative number beyond 20 mm.
    for method in exact_methods() {
        let error = method.solve(&problem("P*sqrt(1 - x/l)", 302.0), Detail::End).unwrap_err();
        let IntegrationError::NoForce { stage: 0, last, .. } = &error else { panic!("{error}") };
        assert!((last.depth / 0.02 - 1.0).abs() < 1e-3, "{error}");
        assert!(error.to_string().contains("sqrt(1 - x/l)"), "{error}");
    }
}

#[test]
fn a_law_that_never_rests_says_so_and_still_leaves_a_target() {
    for force in ["R*V/v1", "R*(V/v1)^1.5", "R*(V/v1)^2"] {
        for (name, method) in methods(1e-8) {
            let error = method.integrator().solve(&problem(force, 100.0), Detail::End).unwrap_err();
            assert!(matches!(error, IntegrationError::NeverEnds { .. }), "{name}, {force}: {error}");
        }
        for method in exact_methods() {
            let flight = method.solve(&problem(force, 100.0).with_exit(0.1), Detail::End).unwrap();
            assert_eq!(flight.outcome, Outcome::Perforated);
        }
    }
}

/// `R (1 - x/l)` slows up to l, and drives from there to no end.
#[test]
fn a_law_that_drives_for_ever_behind_a_barrier_never_ends() {
    for method in exact_methods() {
        let error = method.solve(&problem("R*(1 - x/l)", 100.0), Detail::End).unwrap_err();
        let IntegrationError::NeverEnds { why, last } = error else { panic!("{error}") };
        assert!(why.contains("drives") && last.depth >= 0.02 && last.depth < 1.0, "{why}, {last}");
        // Bounds of the expression do not show it here, and no number is an end.
        let error = method.solve(&problem("R*sqrt(x/l) + R*(1 - x/l)", 100.0), Detail::End).unwrap_err();
        assert!(error.last().is_some_and(|last| last.velocity > 1e100), "{error}");
    }
}

/// Its error bound outgrows its energy on the way, and that is no rest.
#[test]
fn a_force_that_drives_the_more_the_faster_it_is_brings_nothing_to_rest() {
    for method in exact_methods() {
        for force in ["P*(1.3 - 0.11*(V/v1)^2)", "P*(1.3 - 0.15*(V/v1)^2 - 0.1*V/v1)"] {
            let error = method.solve(&problem(force, 400.0), Detail::End).unwrap_err();
            assert!(error.last().is_some_and(|last| last.velocity > 1e10), "{force}: {error}");
        }
    }
}

/// `P exp(-V/v1)` stops it at `M v1²/P ((u - 1) exp(u) + 1)`, `u = V0/v1`. Its error bound grows by exp(u).
#[test]
fn a_flight_goes_on_to_its_rest_though_its_error_bound_outgrows_its_energy() {
    for u in [12.0_f64, 20.0, 35.0, 50.0] {
        for method in exact_methods() {
            let problem = problem("P*exp(-V/v1)", 100.0 * u);
            let p = problem.force(0, 0.0, 0.0);
            let exact = problem.mass * 1e4 / p * ((u - 1.0) * u.exp() + 1.0);
            let depth = method.solve(&problem, Detail::End).unwrap().end.depth;
            assert!((depth / exact - 1.0).abs() <= 1e-13, "{}, u = {u}: {depth} and {exact}", method.name());
        }
    }
}

/// `V² = exp(-2 Q x/M) (V0² - D (1 - exp(-c x)))`, `c = 1/a - 2 Q/M`, `D = 2 P/(M c)`, under `P exp(-x/a) + Q V²`: with D < V0² it is
/// only slowed.
#[test]
fn a_flight_that_is_slowed_for_ever_comes_to_no_rest_however_slow() {
    let text = "projectile.mass = 2\nimpact.velocity = 33\n[parameters]\nP = '2 kN'\na = '70 mm'\nQ = '4 kg/m'\n\
                [[stage]]\nforce = 'P*exp(-x/a) + Q*V^2'\n";
    let problem = Scene::from_toml(text, "slowed").unwrap().problem().unwrap();
    for method in exact_methods() {
        let found = method.solve(&problem, Detail::Events);
        assert!(matches!(found, Err(IntegrationError::NeverEnds { .. })), "{}: {found:?}", method.name());
    }
}

#[cfg(feature = "diffsol")]
#[test]
fn a_force_without_a_value_ahead_is_named_where_steps_are_lost() {
    use crate::integrators::method::{Method, MethodName, MethodOptions};

    let problem = problem("P*sqrt(1 - x/l)", 200.0);
    for name in [MethodName::Tsit45, MethodName::Bdf, MethodName::Adaptive] {
        let found = Method::new(name, &MethodOptions::default()).unwrap().integrator().solve(&problem, Detail::End);
        let why = found.unwrap_err().to_string();
        assert!(why.contains("in `sqrt(1 - x/l)`, the square root of -"), "{name}: {why}");
    }
}

/// The step that finds rest looks behind it, where the force goes on without a kink. Slower than this, the narrow place itself
/// magnifies errors.
#[test]
fn rest_behind_a_narrow_place_is_located_to_the_tolerance() {
    for speed in (210..240).step_by(2) {
        let text = format!(
            "projectile.mass = 2\nimpact.velocity = {speed}\ntarget.thickness = 0.2627\n[parameters]\nP = '300 kN'\n\
             l = '0.2 m'\nv1 = '200 m/s'\n[[stage]]\nforce = 'P*(0.94 + 0.41*log(1 + V/v1) - 0.4*sin(4*x/l) \
             + 0.065*cos(3*V/v1) - 0.35*(0.6 + x/l)*(1 - 0.5*x/l) + 4.82*exp(-((x/l - 0.35)/0.04)^2))'\n"
        );
        let problem = Scene::from_toml(&text, "narrow").unwrap().problem().unwrap();
        let exact = Energy::new().solve(&problem, Detail::End).unwrap();
        for (name, method) in methods(1e-10) {
            let found = method.integrator().solve(&problem, Detail::End).unwrap();
            let error = (found.end.time / exact.end.time - 1.0).abs();
            let allowed = if is_exact(name) { 1e-14 } else { 10.0 * name.promise_at(1e-10) };
            assert_eq!(found.outcome, Outcome::Stopped, "{name}, {speed} m/s");
            assert!(error <= allowed, "{name}, {speed} m/s: {error:e}");
        }
    }
}

/// `P (V/v1)^-n` stops it at `M v1²/(P (2 + n)) (V0/v1)^(2 + n)`.
#[test]
fn a_force_without_bound_at_rest_brings_it_to_rest() {
    for n in [0.3, 0.5, 1.5] {
        for method in exact_methods() {
            let problem = problem(&format!("P*(V/v1)^-{n}"), 100.0);
            let p = problem.force(0, 0.0, 100.0);
            let exact = problem.mass * 1e4 / (p * (2.0 + n));
            let depth = method.solve(&problem, Detail::End).unwrap().end.depth;
            assert!((depth / exact - 1.0).abs() <= 1e-13, "{}, n = {n}: {depth} and {exact}", method.name());
        }
    }
}

/// `P (V/v1)^n`, n < 1, stops it at `M V0²/((2 - n) F0)` after `M V0/((1 - n) F0)`, much of which passes at speeds below any tolerance
/// where n is near one. Beside a static force of a millionth the series tell. `P log(1 + (V/v1)^n)` falls like it: depth (m) and
/// time (s) by quadrature over V^(1-n), mpmath with 30 digits; the last of it, below 1e-12 of V0, goes as its power to a share of V/v1.
#[test]
fn a_force_that_falls_to_rest_brings_it_to_rest_in_its_time() {
    for (n, logarithm) in [
        (0.2, [0.141_105_875_719_559_74, 0.001_022_361_151_483_857_9]),
        (0.5, [0.127_244_396_634_199_1, 0.001_127_199_623_255_805_6]),
        (0.8, [0.118_001_740_561_716_6, 0.001_776_123_968_217_477_4]),
        (0.95, [0.115_214_109_507_507_08, 0.005_288_630_736_742_681]),
    ] {
        let power = format!("(V/v1)^{n}");
        let forces = [format!("P*{power}"), format!("P*({power} + 1e-6)"), format!("P*log(1 + {power})")];
        let [power, held, of_logarithm] = forces.map(|force| problem(&force, 300.0));
        let force = power.force(0, 0.0, 300.0);
        let of_power = [2.0 * 300.0 * 300.0 / ((2.0 - n) * force), 2.0 * 300.0 / ((1.0 - n) * force)];
        let series = Taylor::default().solve(&held, Detail::End).unwrap().end;
        let known = [
            (power, of_power, 1.0),
            (held, [series.depth, series.time], 1.0),
            (of_logarithm, logarithm, 1.0 + 300.0 / 100.0),
        ];
        for (name, method) in methods(1e-8) {
            for (problem, [depth, time], digits) in &known {
                let end = method.integrator().solve(problem, Detail::End).unwrap().end;
                let error = (end.depth / depth - 1.0).abs().max((end.time / time - 1.0).abs());
                let allowed = if is_exact(name) { 1e-12 * digits } else { 100.0 * name.promise_at(1e-8) };
                assert!(error <= allowed, "{name}, n = {n}: {error:e}, {end}");
            }
        }
    }
}

/// Behind a stage in which its error bound outgrew its energy: `-R (1 + V/v1)` drives from rest to V over `M v1²/R (u - ln(1 + u))`,
/// u = V/v1, and 3 MN stop it.
#[test]
fn a_slow_flight_that_is_driven_comes_to_no_rest() {
    let text = "projectile.mass = 2\nimpact.velocity = 3000\n[parameters]\nP = '8e17 N'\nR = '10 kN'\nv1 = '100 m/s'\n\
                [[stage]]\nforce = 'P*exp(-V/v1)'\nend_velocity = 0.0003\n[[stage]]\nforce = '-R*(1 + V/v1)'\nend = 20\n\
                [[stage]]\nstatic_force = 3e6\n";
    let problem = Scene::from_toml(text, "driven").unwrap().problem().unwrap();
    for method in exact_methods() {
        let flight = method.solve(&problem, Detail::Events).unwrap();
        let from = flight.events[0].state.depth;
        let u = (3e6 * (flight.end.depth - 20.0)).sqrt() / 100.0;
        let driven = 2.0 * (u - u.ln_1p());
        assert!((driven / (20.0 - from) - 1.0).abs() < 1e-12, "{}: {}", method.name(), flight.end);
    }
}

/// A stage of coefficients in front of a law and one behind it, against the series over time in double-double.
#[test]
fn stages_of_coefficients_stand_among_laws() {
    let mixed = "[parameters]\nP = '848 kN'\nR = '50 kN'\nv1 = '100 m/s'\n";
    let stages = |first: &str, last: &str| {
        format!(
            "projectile.mass = 2\n{mixed}[[stage]]\n{first}\nend = 0.01\n[[stage]]\nforce = 'P + R*(V/v1)^1.5'\nend = 0.03\n\
             [[stage]]\n{last}\n"
        )
    };
    for [first, last] in [
        ["static_force = 2e5\nstiffness = 1e6", "static_force = 9e5\ndrag = 3"],
        ["static_force = 2e5\nviscosity = 800", "static_force = 7e5\nstiffness = 1e6\nviscosity = 900\ndrag = 2"],
    ] {
        let scene = Scene::from_toml(&stages(first, last), "mixed").unwrap();
        for (speed, exit) in [(100.0, 0.1), (182.0, f64::INFINITY), (250.0, 0.05), (250.0, 0.07), (90.0, f64::INFINITY)]
        {
            let problem = scene.resolve(speed).unwrap().with_exit(exit);
            let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events).unwrap().values();
            for method in exact_methods() {
                let flight = method.solve(&problem, Detail::Events).unwrap();
                assert_eq!(
                    (flight.outcome, kinds(&flight.events)),
                    (exact.outcome, kinds(&exact.events)),
                    "{problem:?}"
                );
                for (ours, known) in flight.events.iter().zip(&exact.events) {
                    let errors = [
                        (ours.state.time - known.state.time) / exact.end.time,
                        (ours.state.depth - known.state.depth) / exact.end.depth,
                        (ours.state.velocity - known.state.velocity) / speed,
                    ];
                    assert!(errors.iter().all(|error| error.abs() < 1e-15), "{}: {errors:?}", method.name());
                }
                if let Some(margin) = flight.exit_margin {
                    let off = (margin - exact.exit_margin.unwrap()).abs();
                    assert!(off <= flight.exit_margin_error.unwrap(), "{}: {off:e}", method.name());
                    assert_eq!(method.exit_margin(&problem).unwrap().unwrap().value, margin);
                }
            }
        }
    }
    let alone = Scene::from_toml("projectile.mass = 2\n[[stage]]\nviscosity = 5\nstiffness = 9\n", "viscous").unwrap();
    let error = Energy::new().solve(&alone.resolve(100.0).unwrap(), Detail::End).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("viscosity of 5 kg/s"), "{error}");
}

#[test]
fn the_exit_margin_is_continuous_and_its_bound_holds_next_to_the_critical_speed() {
    for (force, speed, depth, ..) in [KNOWN[0], KNOWN[4], KNOWN[8], KNOWN[10], KNOWN[13]] {
        // The impact speed is critical for a target as thick as the depth of rest.
        for nearness in [1e-3, 1e-9, 1e-12] {
            for side in [-1.0, 1.0] {
                let exit = depth * (1.0 + side * nearness);
                for (name, method) in methods(1e-10) {
                    let flight =
                        method.integrator().solve(&problem(force, speed).with_exit(exit), Detail::End).unwrap();
                    let is_right = flight.outcome == Outcome::Undecided || flight.outcome.is_stop() == (side > 0.0);
                    assert!(is_right, "{name}, {force}: {} at {exit}", flight.outcome);
                    let is_past = flight.exit_margin.is_some_and(|margin| margin > 0.0);
                    let agrees = is_past == (flight.outcome == Outcome::Perforated);
                    assert!(flight.outcome == Outcome::Undecided || agrees, "{name}, {force}: {flight:?}");
                    let resolves = is_exact(name) && nearness > 1e-11;
                    assert!(!resolves || flight.outcome != Outcome::Undecided, "{name}, {force}, {nearness}");
                }
            }
        }
    }
}

/// R (1 - x/l) slows the projectile down to x = l and drives it beyond: W(l) = V0² - R l/M.
#[test]
fn the_exit_margin_is_that_of_the_least_velocity_inside_a_stage() {
    let problem = problem("R*(1 - x/l)", 100.0).with_exit(0.035);
    for (name, method) in methods(1e-10) {
        let margin = method.integrator().exit_margin(&problem).unwrap().unwrap();
        let error = margin.error.unwrap();
        assert!((margin.value - 0.95).abs() <= error && error < 1e-5, "{name}: {} +- {error}", margin.value);
    }
    for velocity in VelocityAt::ALL {
        let scheme = CentralDifference::uniform(1e-7, velocity, Boundaries::Interpolated);
        let margin = scheme.exit_margin(&problem).unwrap().unwrap().value;
        assert!((margin - 0.95).abs() <= 1e-4, "{velocity}: {margin}");
    }
}

#[test]
fn error_bounds_of_margins_hold_for_laws_with_kinks_and_falling_slopes() {
    for force in [
        "R*max(0, 1 - ((x/l - 1)/0.3)^2)",
        "R*0.1 + P*max(0, 1 - abs(x/l - 1)/0.2)",
        "P*exp(-V/v1)",
        "P*(1 + b*cos(V/v1*3)) + R*min(1, V/v1)",
        "R*abs(sin(3*x/l))*(1 + b*V/v1)",
        "R*(1 - x/l) + R*b*(V/v1)^1.5",
    ] {
        for (speed, exit) in [(60.0, 0.03), (102.0, 0.05), (202.0, 0.025)] {
            let problem = problem(force, speed).with_exit(exit);
            let known = Taylor::default().exit_margin(&problem).unwrap().unwrap();
            for (name, method) in methods(1e-7) {
                let margin = method.integrator().exit_margin(&problem).unwrap().unwrap();
                let off = (margin.value - known.value).abs();
                let bound = margin.error.unwrap() + known.error.unwrap();
                assert!(off <= bound, "{name}, {force}, {speed}: {off:e} of {bound:e}");
            }
        }
    }
}

/// `M x'' = -R (1 - x/l) - r x'` has a saddle at x = l, and the only path that ends there has the speed `V = k (l - x)`
/// with `M k² - r k - R/l = 0`.
#[test]
fn the_critical_speed_of_a_viscous_barrier_is_found() {
    let problem = problem("R*(1 - x/l) + R*b*V/v1", 100.0).with_exit(0.035);
    let resolve = |speed| Ok(Problem { impact_speed: speed, ..problem.clone() });
    let (barrier, viscosity) = (50e3_f64, 50e3 * 0.2 / 100.0);
    let exact = 0.02 * (viscosity + (viscosity * viscosity + 8.0 * barrier / 0.02).sqrt()) / 4.0;
    for method in exact_methods() {
        let critical = crate::studies::critical_velocity::critical_velocity(resolve, &*method).unwrap();
        let off = (critical.velocity - exact).abs();
        assert!(off <= critical.error_bar.unwrap() && off < 1e-6 * exact, "{critical:?} and {exact}");
    }
}

/// Enclosures of a force that vanishes at rest are wide; all others are as narrow as numbers allow.
#[test]
fn enclosures_of_laws_hold_the_known_rest() {
    for (force, speed, depth, time, ..) in KNOWN.into_iter().filter(|(force, ..)| *force != "R*(V/v1)^0.2") {
        let flight = Enclosure.enclose(&problem(force, speed).cast(), Detail::Events).unwrap();
        assert_eq!(flight.outcome, Outcome::Stopped, "{force}");
        for (ball, known) in [(flight.end.depth, depth), (flight.end.time, time)] {
            let (low, high) = ball.interval();
            // The known numbers are rounded, and so are the parameters.
            let slack = 4.0 * f64::EPSILON * known;
            assert!(low - slack <= known && known <= high + slack, "{force}: {known} in {low} .. {high}");
            assert!(high - low <= slack, "{force}: {low} .. {high}");
        }
    }
    let open = Enclosure.enclose(&problem("R*(V/v1)^0.2", 202.0).cast(), Detail::Events).unwrap();
    assert_eq!(open.outcome, Outcome::Undecided);
}

/// Whether two balls have a number in common.
fn meet(a: Ball, b: Ball) -> bool {
    (a - b).value().abs() <= (a - b).radius
}

/// Two proofs of the same flight that share the arithmetic alone.
#[test]
fn an_enclosure_of_coefficients_meets_that_of_the_same_expression() {
    let random = &mut Random::new(77);
    let (mut compared, mut widest) = (0, 0.0_f64);
    for kind in [Kind::Crater, Kind::Tunnel, Kind::SpringAndDrag, Kind::Viscous, Kind::ViscousSpring, Kind::Several] {
        for _ in 0..40 {
            let Some(problem) = kind.draw(random) else { continue };
            let as_text = written(&problem);
            let [one, other] =
                [&problem, &as_text].map(|problem| Enclosure.enclose(&problem.cast::<Ball>(), Detail::Events));
            let (Ok(one), Ok(other)) = (one, other) else { continue };
            if [one.outcome, other.outcome].contains(&Outcome::Undecided) {
                continue;
            }
            compared += 1;
            assert_eq!(one.outcome.is_stop(), other.outcome.is_stop(), "{problem:?}");
            assert_eq!(one.events.len(), other.events.len(), "{problem:?}");
            for (one, other) in one.events.iter().zip(&other.events) {
                let (one, other) = (one.state, other.state);
                let meets = [(one.time, other.time), (one.depth, other.depth), (one.velocity, other.velocity)];
                assert!(meets.iter().all(|(one, other)| meet(*one, *other)), "{one:?} {other:?} {problem:?}");
                widest = widest.max(other.time.radius / other.time.value());
            }
        }
    }
    println!("{compared} compared, times known to {widest:e}");
    assert!(compared > 150 && widest < 1e-12, "{compared} {widest:e}");
}

/// A random force of two or three terms, with kinks, slopes of either sign, and branch points at rest. Its numbers are the same in
/// binary: an enclosure takes them for decimals.
fn random_force(random: &mut Random) -> String {
    const TERMS: [&str; 22] = [
        "P",
        // Kinks at one place, b v1, and powers and logarithms that no power of V makes smooth.
        "R*abs(V/v1 - b)",
        "R*max(V/v1, b)^0.23",
        "P*b*log(max(5*V/v1, 1))",
        "R*(V/v1)^0.027",
        "R",
        "Q*V^2",
        "R*(V/v1)^1.5",
        "P*exp(-V/v1)",
        "P*b*log(1 + V/v1)",
        "R*sqrt(1 + (V/v1)^2)",
        "P*tanh(x/l)",
        "R*abs(x/l - 1)",
        "P*max(0, 1 - abs(x/l - 1)/0.25)",
        "R*min(1, V/v1)",
        "P*(1 + b*cos(3*V/v1))",
        "Q*max(V^2 - v1^2, 0)",
        "R*(1 - x/l)",
        "P*atan(V/v1)*b",
        "R*sqrt(x/l)",
        "P*exp(-((x/l - 1)/0.375)^2)",
        "R*(0.5 + V/v1)^-0.75",
    ];
    let mut terms = vec!["P"; usize::from(random.chance(0.7))];
    for _ in 0..=random.below(2) {
        terms.push(TERMS[random.below(TERMS.len())]);
    }
    terms.join(" + ")
}

/// Series of double-doubles know flights through kinks and branch points to 17 digits.
#[test]
fn enclosures_of_random_laws_hold_the_answer_in_double_double() {
    let random = &mut Random::new(20);
    let (mut compared, mut undecided) = (0, 0);
    let count = std::env::var("PENETRODE_CASES").map_or(150, |cases| cases.parse().unwrap());
    while compared < count {
        let force = random_force(random);
        let mut problem = problem(&force, random.log_uniform(10.0, 700.0));
        if random.chance(0.6) {
            problem = problem.with_exit(random.log_uniform(2e-3, 0.3));
        }
        let Ok(exact) = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events) else { continue };
        let flight = Enclosure.enclose(&problem.cast(), Detail::Events).unwrap();
        compared += 1;
        if flight.outcome == Outcome::Undecided || exact.outcome == Outcome::Undecided {
            undecided += 1;
            continue;
        }
        assert_eq!(flight.outcome, exact.outcome, "{force} {problem:?}");
        let scale = [exact.end.time.value(), exact.end.depth.value(), problem.impact_speed];
        for (event, exact) in flight.events.iter().zip(&exact.events) {
            let (ours, known) = (event.state, exact.state);
            let pairs = [(ours.time, known.time), (ours.depth, known.depth), (ours.velocity, known.velocity)];
            for ((ball, exact), scale) in pairs.into_iter().zip(scale) {
                let distance = ((exact.hi() - ball.mid.hi) + (exact.lo() - ball.mid.lo)).abs();
                let slack = 1e-16 * scale;
                assert!(distance <= ball.radius + slack, "{force}: {ball:?} {exact:?}, {problem:?}");
            }
        }
    }
    println!("{compared} compared, {undecided} undecided");
    assert!(undecided * 10 <= compared, "{undecided}");
}

/// Exit velocity of M V' = -(a - b V) by mpmath, 30 digits: the error of a number of the law grows as the force falls with V.
#[test]
fn an_enclosure_grows_where_the_force_falls_with_the_velocity() {
    for (exit, known) in [("2 m", 299.764_384_762_091_1), ("3 m", 293.241_881_203_045_2)] {
        let text = format!(
            "projectile.mass = 1\nimpact.velocity = 300\ntarget.thickness = \"{exit}\"\n[parameters]\nF0 = \"1 N\"\n\
             v1 = \"1 m/s\"\n[[stage]]\nforce = \"F0*(300000.30000000002620 - 1000*V/v1)\"\n"
        );
        let file = SceneFile::from_toml(&text, "law", &[]).unwrap();
        let flight = crate::studies::enclosure::flight(&file.scene, &file.written, Detail::End).unwrap().unwrap();
        let (low, high) = flight.end.velocity.interval();
        assert!(low <= known && known <= high && high - low < 1e-7, "{exit}: {known} in {low} .. {high}");
    }
}

/// Of a base that may be negative, and of a force without a value, nothing is proved.
#[test]
fn powers_and_roots_of_what_may_be_negative_prove_nothing_false() {
    for (force, rest) in [
        ("P*(1.00000000000000001 + (V/v1 - 1)^2)", Some(0.156_712_816_475_2)),
        ("P*(1 + (V/v1 - 1)^(1/3*6))", None),
        ("P*(1 + (V/v1 - 1)^(0.1*30))", None),
        ("P*(1 + (1 - V/v1)^(0.1*30))", None),
        ("P*(1 + sqrt((V - v1)/v1))", None),
        ("P*(1 + sqrt((x - l)*(x - l - 1e-12*l)/l^2))", None),
    ] {
        let text = format!(
            "projectile.mass = 2\nimpact.velocity = 300\n[parameters]\nP = \"300 kN\"\nv1 = \"100 m/s\"\nl = \"0.05 m\"\n\
             [[stage]]\nforce = \"{force}\"\n"
        );
        let text = if force.contains('l') { text } else { text.replace("l = \"0.05 m\"\n", "") };
        let text = if force.contains("v1") { text } else { text.replace("v1 = \"100 m/s\"\n", "") };
        let file = SceneFile::from_toml(&text, "law", &[]).unwrap();
        let flight = crate::studies::enclosure::flight(&file.scene, &file.written, Detail::End).unwrap().unwrap();
        match rest {
            Some(rest) => assert!((flight.end.depth.value() - rest).abs() < 1e-12, "{force}: {:?}", flight.end),
            None => assert_eq!(flight.outcome, Outcome::Undecided, "{force}"),
        }
    }
}

/// Series over time and over depth share the expression and no variable: in double-double they agree to 30 digits.
#[test]
fn series_over_time_and_over_depth_agree_to_the_digits_of_double_double() {
    for (force, speed, _, _, exit, _) in KNOWN {
        for problem in [problem(force, speed), problem(force, speed).with_exit(exit)] {
            let problem = problem.cast::<TwoFloat>();
            let over_time = Taylor::default().solve_in(&problem, Detail::Events).unwrap();
            let over_depth = Energy::new().solve_in(&problem, Detail::Events).unwrap();
            assert_eq!(kinds(&over_time.values().events), kinds(&over_depth.values().events), "{force}");
            let (a, b) = (over_time.end, over_depth.end);
            let pairs = [(a.time, b.time), (a.depth, b.depth), (a.velocity, b.velocity)];
            let errors = pairs.map(|(a, b)| ((a - b).value() / a.value().max(f64::MIN_POSITIVE)).abs());
            let worst = errors.into_iter().fold(0.0, f64::max);
            assert!(worst < 1e-30, "{force}: {worst:e}");
        }
    }
}

/// Against series of double-doubles over time.
#[test]
fn random_laws_are_solved_over_time_and_over_depth_within_the_error_bounds() {
    let (random, mut compared) = (&mut Random::new(33), 0);
    // Of each method: error of the margin over its bound, of the depth of rest and of its time.
    let mut worst = [[0.0_f64; 3]; 2];
    while compared < 300 {
        let force = random_force(random);
        let mut problem = problem(&force, random.log_uniform(10.0, 700.0));
        if random.chance(0.6) {
            problem = problem.with_exit(random.log_uniform(2e-3, 0.3));
        }
        let Ok(exact) = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::Events) else { continue };
        let exact = exact.values();
        if exact.outcome == Outcome::Undecided {
            continue;
        }
        compared += 1;
        for (method, worst) in exact_methods().into_iter().zip(&mut worst) {
            let flight = method.solve(&problem, Detail::Events).unwrap();
            let said = format!("{}, {force}, {problem:?}", method.name());
            assert_eq!((flight.outcome, kinds(&flight.events)), (exact.outcome, kinds(&exact.events)), "{said}");
            let mut errors = [0.0; 3];
            if let (Some(margin), Some(bound)) = (flight.exit_margin, flight.exit_margin_error) {
                errors[0] = (margin - exact.exit_margin.unwrap()).abs() / bound;
            }
            if flight.outcome.is_stop() {
                errors[1] = (flight.end.depth / exact.end.depth - 1.0).abs();
                errors[2] = (flight.end.time / exact.end.time - 1.0).abs();
            }
            assert!(errors[0] <= 1.0 && errors[1].max(errors[2]) < 2e-14, "{errors:?} {said}");
            *worst = std::array::from_fn(|place| worst[place].max(errors[place]));
        }
    }
    println!("{worst:?}");
}

/// Laws of the velocity alone, by integrals over it; what 24 places do not show is for the series.
#[test]
fn laws_of_velocity_are_solved_to_rounding_whatever_hides_between_two_places() {
    const FORCES: [(&str, u64); 13] = [
        ("P + R*(V/v1)^1.5", 1),
        ("P + R*(V/v1)^-0.5", 24),
        ("R*sqrt(V/v1)", 1),
        ("R*(V/v1)^(1/3) + Q*V^2", 2),
        ("P*(1 + b*log(max(V/v1, 0.05)))", 2),
        ("P*max((5*V/v1)^0.027, 0.5*(5*V/v1)^0.3)", 4),
        ("P + R*max(1, (V/v1 - 1)^2)", 3),
        // A spike, and switches that touch zero, pass it twice in a hundredth of the way, or stay there.
        ("P + 9*P*exp(-((V/v1 - 0.7)/0.002)^2)", 120),
        ("P + R*max(0, 1 - abs(V/v1 - 0.61)/0.001)", 8),
        ("P + R*abs((V/v1 - 0.3)^2)", 6),
        ("P + P*max(0, 1e-5 - (V/v1 - 0.437)^2)*1e5", 9),
        ("P + R*max(0, 1e-5 - (V/v1 - 0.437)^2)*1e5", 9),
        ("P + R*max(0, min(V/v1, 0*V/v1))", 1),
    ];
    solved_to_rounding(&FORCES);
}

/// By integrals over depth; what 24 places do not show is for the series.
#[test]
fn forces_of_depth_and_the_square_of_velocity_are_solved_to_rounding() {
    solved_to_rounding(&[
        ("P*(1 - exp(-x/l)) + Q*V^2", 3),
        ("P + P*tanh((x/l - 1)/0.2) + R + Q*V^2", 10),
        ("(P + R*sin(5*x/l))*(1 + (V/v1)^2)", 4),
        ("R*(x/l)^3 + Q*(1 + atan(x/l))*V*V", 5),
        ("(P + Q*V^2)/(1 + x/l)^0.7", 7),
        ("P*sqrt(0.01 + x/l)", 14),
        ("R*log(1.1 + x/l) + Q*exp(-x/l)*(V - 2*V)^2", 7),
        ("P + 9*P*exp(-((x/l - 0.7)/0.002)^2)", 60),
        ("P + Q*V^2*exp(-((x/l - 0.3)/0.01)^2)", 40),
        // It drives on a part of the way, or may.
        ("P - 1.5*P*exp(-((x/l - 0.5)/0.2)^2) + Q*V^2", 15),
    ]);
}

/// Rest and the state at a far side of each force to 1e-14 of the same in double-double, which goes by series, within so many steps.
fn solved_to_rounding(forces: &[(&str, u64)]) {
    let random = &mut Random::new(8);
    let mut nearest = 0.0_f64;
    for (force, steps) in forces.iter().copied() {
        for _ in 0..20 {
            let speed = random.log_uniform(50.0, 400.0);
            let free = problem(force, speed);
            let rest = Taylor::default().solve(&free, Detail::End).unwrap();
            assert!(rest.cost.steps <= steps, "{force}, {speed}: {} steps", rest.cost.steps);
            for problem in [free.clone(), free.with_exit(rest.end.depth * random.uniform(0.02, 1.2))] {
                let exact = Taylor::default().solve_in(&problem.cast::<TwoFloat>(), Detail::End).unwrap().values();
                let flight = Taylor::default().solve(&problem, Detail::End).unwrap();
                let said = format!("{force}, {problem:?}");
                assert_eq!(flight.outcome, exact.outcome, "{said}");
                let scales = [exact.end.time, exact.end.depth, speed];
                let [ours, known] = [flight.end, exact.end].map(|end| [end.time, end.depth, end.velocity]);
                for place in 0..3 {
                    assert!((ours[place] - known[place]).abs() <= 1e-14 * scales[place], "{ours:?} {known:?} {said}");
                }
                // A force without bound at rest leaves a margin without bound.
                if let (Some(margin), Some(bound)) = (flight.exit_margin, flight.exit_margin_error)
                    && margin.is_finite()
                {
                    let share = (margin - exact.exit_margin.unwrap()).abs() / bound;
                    assert!(share <= 1.0, "{share} {said}");
                    nearest = nearest.max(share);
                }
            }
        }
    }
    assert!(nearest > 0.1, "{nearest}");
}

/// Each was stepped over by `energy`, or by the library's methods: a term far below half of the force, and narrow.
#[test]
fn a_small_narrow_term_is_not_stepped_over() {
    for (force, speed) in [
        ("P + 0.01*P*exp(-((V/v1 - 0.6237)/0.0446)^2)", 300.0),
        ("P + R*sqrt(abs(V/v1 - 2.5435)) + R*0.285*exp(-((V/v1 - 0.1269)/0.00119)^2)", 55.8),
        ("P + 0.6*R*exp(-((V/v1 - 0.216)/0.0006)^2) + R*max(0, 1 - ((V/v1 - 0.1089)/0.0022)^2)", 150.0),
        // Below a twentieth of the velocity, and beside a term that changes by more.
        ("P + R*2.047*exp(-((V/v1 - 0.1507)/0.01197)^2)", 585.0),
        ("P + R*(1 + tanh((V/v1 - 0.432)/0.0377)) + 0.745*R*exp(-((V/v1 - 0.4008)/0.0002)^2)", 47.55),
        ("P + 0.6*R*exp(-((x/l - 1.3)/0.002)^2)", 300.0),
        // Its switch grows so large by the end of the first step that the roots of it are lost in roundings there.
        ("P + 0.1*R*max(0, 1 - ((x/l - 2.16)/0.001178)^2) + 0.1581*R*exp(-((x/l - 1.016)/0.0004073)^2)", 443.6),
        // Hidden in a switch: each side of it is smooth, and nothing of the other is there at the places asked.
        ("P + R*max(0, exp(-((x/l - 1.3)/0.002)^2) - 0.5)", 300.0),
        ("P + R*max(0.3, exp(-((V/v1 - 1.3)/0.02)^2))", 300.0),
        ("P + R*min(1, 2 - 3*exp(-((x/l - 1.3)/0.02)^2))", 300.0),
        // A thousandth of the force, and of the way.
        ("P + 0.001*P*exp(-((V/v1 - 0.6237)/0.001)^2)", 300.0),
        ("P*(1 + x/l*exp(-x/l)) + 1e-4*P/(1 + ((x/l - 1.7)/0.001)^2)", 250.0),
        // Its switch has one side at both ends of a long step.
        ("P + R*0.4158*max(0, 1 - ((V/v1 - 0.4309)/0.0139)^2)", 105.5),
        // Two roots of a switch in a twentieth of its period, which series over a long step miss together.
        ("P + R*max(0, sin(40*x/l) - 0.99)", 300.0),
        ("P + R*max(0, sin(400*x/l) - 0.99)", 300.0),
        ("P + R*max(0, cos(9*V/v1) - 0.97)", 300.0),
        // A kink close to rest, on a step of a library method that turns round behind both.
        ("P + 2.474*R*max(0, sin(9*x/l)*exp(-x/l) - 0.3)", 24.41),
        // Bounds show that it keeps its side on a step over most of its period: its series, which does not show it there, has a root.
        ("P + 0.5818*R*max(0, sin(60*x/l) - 0.97)", 167.9),
        // A kink that `bdf` locates too early, and a step from there that begins on its old side.
        (
            "P*(1.01 - exp(-x/l)) + 2.234*R*max(0, 1 - ((x/l - 2.004)/0.1078)^2) + 0.0345*R*max(0, 1 - ((x/l - 0.5091)/0.01876)^2)",
            141.32,
        ),
    ] {
        let problem = problem(force, speed);
        let [ours, theirs] = exact_methods().map(|method| method.solve(&problem, Detail::End).unwrap().end);
        assert!((ours.depth / theirs.depth - 1.0).abs() < 1e-12, "{force}: {ours:?} {theirs:?}");
        assert!((ours.time / theirs.time - 1.0).abs() < 1e-12, "{force}: {ours:?} {theirs:?}");
        #[cfg(feature = "diffsol")]
        for scheme in [Scheme::Tsit45, Scheme::Bdf] {
            let flight = Diffsol::new(scheme, 1e-10).solve(&problem, Detail::End).unwrap();
            let off = (flight.end.depth / ours.depth - 1.0).abs();
            assert!(off < 1e-7 && flight.cost.steps < 20_000, "{}, {force}: {off:e}, {:?}", scheme.name(), flight.cost);
            // Each of up to 20,000 steps adds to the time.
            let late = (flight.end.time / ours.time - 1.0).abs();
            assert!(late < 2e-7, "{}, {force}: {late:e}, {:?}", scheme.name(), flight.cost);
        }
        // Both may miss the same: a sum over the middles of equal parts, far narrower than the term, sees it.
        let law = problem.laws.of(0).unwrap();
        let sum_to = |end: f64, value: &dyn Fn(f64) -> f64| -> f64 {
            let part = end / 400_000.0;
            (0..400_000).map(|place| part * value((f64::from(place) + 0.5) * part)).sum()
        };
        let mass = problem.mass;
        let known = if force.contains('x') && !force.contains("V/") {
            sum_to(ours.depth, &|x| law.force_value(x, 0.0)) / (0.5 * mass * speed * speed)
        } else {
            sum_to(speed, &|v| mass * v / law.force_value(0.0, v)) / ours.depth
        };
        assert!((known - 1.0).abs() < 1e-9, "{force}: {known}");
    }
}

/// Next to nothing resists at rest, and the energy is lost in its error bound long before: a far side behind the rest changes nothing.
#[test]
fn the_rest_of_a_flight_that_hardly_anything_ends_is_the_same_with_a_far_side() {
    for force in
        ["P*(exp(-20 - x/l) + V/v1)", "P*(1e-8*(1 + x/l) + V/v1*(1 + 0.1*x/l))", "P*(exp(-25) + V/v1*(2 + x/l))"]
    {
        let endless = problem(force, 30.0);
        for method in exact_methods() {
            let rest = method.solve(&endless, Detail::End).unwrap().end;
            let target = endless.clone().with_exit(1.5 * rest.depth);
            let flight = method.solve(&target, Detail::End).unwrap();
            assert_eq!(flight.outcome, Outcome::Stopped, "{}, {force}", method.name());
            let found = flight.end;
            assert!((found.depth / rest.depth - 1.0).abs() < 1e-12, "{}, {force}: {found:?} {rest:?}", method.name());
            assert!((found.time / rest.time - 1.0).abs() < 1e-10, "{}, {force}: {found:?} {rest:?}", method.name());
        }
    }
}

/// Close to its root next to nothing is left of such a power beside another force.
#[test]
fn powers_above_two_that_have_a_branch_point_are_left_like_those_below() {
    for force in
        ["P*(0.1 + (x/l)^2.5)", "P*(0.1 + sqrt(x/l)*(x/l)^2)", "P + R*max(x/l - 0.5, 0)^2.05", "P + R*(x/l)^4.5"]
    {
        let problem = problem(force, 100.0);
        let ends = exact_methods().map(|method| method.solve(&problem, Detail::End).unwrap().end);
        assert!((ends[0].depth / ends[1].depth - 1.0).abs() < 1e-12, "{force}: {ends:?}");
        #[cfg(feature = "diffsol")]
        {
            let theirs = Diffsol::new(Scheme::Tsit45, 1e-10).solve(&problem, Detail::End).unwrap().end;
            assert!((ends[0].depth / theirs.depth - 1.0).abs() < 1e-7, "{force}: {ends:?} {theirs:?}");
        }
    }
}

/// What a step leaves out is more than its last coefficients say where those are small by chance.
#[test]
fn error_bounds_of_margins_hold_at_every_tolerance() {
    let (random, mut compared) = (&mut Random::new(57), 0);
    let mut cases = vec![(
        "P + R*max(sqrt(1 + 2*V/v1) + 1 - exp(-(1 + x/l)), max(max(1, (4*V/v1)^0.2), 4*V/v1))".to_owned(),
        455.6,
        0.0946,
    )];
    cases.extend(
        (0..200).map(|_| (random_force(random), random.log_uniform(10.0, 700.0), random.log_uniform(2e-3, 0.3))),
    );
    for (force, speed, exit) in cases {
        let problem = problem(&force, speed).with_exit(exit);
        let Ok(exact) = Taylor::default().solve(&problem, Detail::End) else { continue };
        let (Some(margin), Some(bound)) = (exact.exit_margin, exact.exit_margin_error) else { continue };
        compared += 1;
        for rtol in [1e-3, 1e-5, 1e-7, 1e-9, 1e-11] {
            let methods: [Box<dyn Integrator>; 2] =
                [Box::new(Taylor::with_rtol(rtol).unwrap()), Box::new(Energy::with_rtol(rtol).unwrap())];
            for method in methods {
                let flight = method.solve(&problem, Detail::End).unwrap();
                let (found, allowed) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap() + bound);
                let off = (found - margin).abs();
                assert!(
                    off <= allowed,
                    "{} at {rtol:e}: {off:e} and not {allowed:e}, {force}, {speed}, {exit}",
                    method.name()
                );
            }
        }
    }
    assert!(compared > 150, "{compared}");
}

/// In dual numbers, with a switch too: a step begins where both of its sides have one value and two slopes.
#[test]
fn derivatives_over_depth_are_those_over_time() {
    for (force, speed, _, _, exit, _) in KNOWN {
        for problem in [problem(force, speed), problem(force, speed).with_exit(exit)] {
            let mut dual = problem.cast::<num_dual::Dual64>();
            dual.impact_speed.eps = 1.0;
            dual.mass.eps = -0.3;
            let a = Taylor::default().solve_in(&dual, Detail::End).unwrap().end;
            let b = Energy::new().solve_in(&dual, Detail::End).unwrap().end;
            for (a, b) in [(a.time, b.time), (a.depth, b.depth), (a.velocity, b.velocity)] {
                let scale = a.re.abs() / speed + a.eps.abs() + f64::MIN_POSITIVE;
                assert!((a.eps - b.eps).abs() <= 1e-13 * scale, "{force}: {a} and {b}");
            }
        }
    }
}

#[test]
fn states_at_given_times_are_those_of_the_other_variable() {
    for (force, speed, depth, time, ..) in KNOWN {
        let times: Vec<_> = (0..16).map(|i| time * f64::from(i) / 16.0).collect();
        let [one, other] = exact_methods().map(|method| {
            let flight = method.solve(&problem(force, speed), Detail::Times(&times)).unwrap();
            flight.trajectory
        });
        assert_eq!((one.len(), other.len()), (16, 16), "{force}");
        for (a, b) in one.iter().zip(&other) {
            assert_eq!(a.state.time, b.state.time, "{force}");
            assert!((a.state.depth - b.state.depth).abs() <= 1e-14 * depth, "{force}: {a:?} {b:?}");
            assert!((a.state.velocity - b.state.velocity).abs() <= 1e-14 * speed, "{force}: {a:?} {b:?}");
        }
    }
}
