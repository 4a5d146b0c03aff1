//! Faults of a solver that reads the physical scene: its parameters, and what is formed of them.

use super::{Change, GRAINS, Hypothesis, Parameter, of, to_grain};
use crate::physics::semi_empirical::perforated_thickness_ratio;
use crate::physics::{Concrete, CraterStiffness, Criterion, Resistance, Scene, Stage};

/// The same of strengths (Pa).
const STRENGTHS: &[f64] = &[1e3, 1e4, 1e5, 1e6, 1e7];

fn concrete(scene: &mut Scene, alter: impl FnOnce(&mut Concrete)) {
    if let Resistance::Concrete(concrete) = &mut scene.resistance {
        alter(concrete);
    }
}

/// The tunnel of a scene, its impact speed and its mass.
fn set_crater(scene: &mut Scene, stiffness: impl FnOnce(&Stage, f64, f64, f64) -> f64) {
    let Ok(problem) = scene.problem() else { return };
    let (depth, tunnel) = problem.crater_depth_and_tunnel();
    concrete(scene, |concrete| {
        if concrete.crater_stiffness == CraterStiffness::Continuous && depth > 0.0 {
            let stiffness = stiffness(&tunnel, depth, problem.impact_speed, problem.mass);
            concrete.crater_stiffness = CraterStiffness::Given(stiffness);
        }
    });
}

fn scale_area(scene: &mut Scene, factor: f64) {
    concrete(scene, |concrete| {
        concrete.density *= factor;
        concrete.static_factor *= factor;
    });
}

fn scale_static_factor(scene: &mut Scene, factor: f64, is_meant: impl Fn(&Concrete) -> bool) {
    concrete(scene, |concrete| {
        if is_meant(concrete) {
            concrete.static_factor *= factor;
        }
    });
}
/// S by Eq. 14 of another strength.
fn set_strength(concrete: &mut Concrete, strength: f64) {
    if concrete.follows_eq14 {
        concrete.static_factor = crate::physics::semi_empirical::static_factor(strength);
    }
}

/// Faults of parameters.
pub(super) static FAULTS: &[Hypothesis] = &[
    of(
        "input-rounded",
        "the density is rounded to a multiple of {} kg/m³",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| concrete(s, |c| c.density = to_grain(c.density, grain)))],
    ),
    of(
        "input-rounded",
        "the strength is rounded to a multiple of {} Pa",
        Parameter::OneOf(STRENGTHS),
        &[Change::Scene(|s, grain| {
            concrete(s, |c| {
                let rounded = to_grain(c.strength, grain);
                if c.follows_eq14 {
                    c.static_factor = crate::physics::semi_empirical::static_factor(rounded);
                }
                c.strength = rounded;
            });
        })],
    ),
    of(
        "input-rounded",
        "the diameter is rounded to a multiple of {} m",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| concrete(s, |c| c.diameter = to_grain(c.diameter, grain)))],
    ),
    of(
        "parameter:diameter",
        "the diameter is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| concrete(s, |c| c.diameter *= f))],
    ),
    of(
        "parameter:area",
        "the area pi d²/4 is {} times the right one (4 is pi d²)",
        Parameter::Factor,
        &[Change::Scene(scale_area)],
    ),
    of(
        "parameter:density",
        "density, nose factor or B, which act as one product, is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| concrete(s, |c| c.density *= f))],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor is left out: N* = 1",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.nose_factor = 1.0))],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor enters as N*^{}",
        Parameter::Exponent(1.0),
        &[Change::Scene(|s, n| {
            concrete(s, |c| {
                c.density *= c.nose_factor.powf(n - 1.0);
            });
        })],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor multiplies P too",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.static_factor *= c.nose_factor))],
    ),
    of(
        "parameter:B",
        "B multiplies P too",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.static_factor *= c.inertia_factor))],
    ),
    of(
        "parameter:B",
        "N* B multiplies P too",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.static_factor *= c.nose_factor * c.inertia_factor))],
    ),
    of(
        "parameter:B",
        "B is left out: B = 1",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.inertia_factor = 1.0))],
    ),
    of(
        "parameter:B",
        "B enters as B^{}",
        Parameter::Exponent(1.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.inertia_factor = c.inertia_factor.powf(n)))],
    ),
    of(
        "parameter:strength",
        "the strength is {} times the right one, in Eq. 14 too",
        Parameter::Factor,
        &[Change::Scene(|s, f| {
            concrete(s, |c| {
                c.strength *= f;
                if c.follows_eq14 {
                    c.static_factor /= f.abs().sqrt();
                }
            });
        })],
    ),
    of(
        "parameter:S",
        "S, or the strength it multiplies, is {} times the right one",
        Parameter::Unit,
        &[Change::Scene(|s, f| scale_static_factor(s, f, |_| true))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is {} times the right one; 0.001 is a strength in Pa",
        Parameter::Unit,
        &[Change::Scene(|s, f| scale_static_factor(s, f, |c| c.follows_eq14))],
    ),
    of(
        "parameter:S",
        "S is {} times the right one where it is stated",
        Parameter::Unit,
        &[Change::Scene(|s, f| scale_static_factor(s, f, |c| !c.follows_eq14))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 holds (fc/MPa)^-{}, not ^-0.5",
        Parameter::Exponent(0.5),
        &[Change::Scene(|s, n| {
            concrete(s, |c| {
                if c.follows_eq14 {
                    c.static_factor *= (1e-6 * c.strength).powf(0.5 - n);
                }
            });
        })],
    ),
    of(
        "parameter:S",
        "a stated S is ignored: Eq. 14 is used",
        Parameter::None,
        &[Change::Scene(|s, _| {
            concrete(s, |c| {
                c.static_factor = crate::physics::semi_empirical::static_factor(c.strength);
            });
        })],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is that of another formula: 82.6 (fc/MPa)^-0.544",
        Parameter::None,
        &[Change::Scene(|s, _| {
            concrete(s, |c| {
                if c.follows_eq14 {
                    c.static_factor = 82.6 * (1e-6 * c.strength).powf(-0.544);
                }
            });
        })],
    ),
    of(
        "parameter:S",
        "S is always {}",
        Parameter::Value(0.3),
        &[Change::Scene(|s, value| concrete(s, |c| c.static_factor = value))],
    ),
    of(
        "parameter:density",
        "the density is always {} kg/m³",
        Parameter::Value(0.3),
        &[Change::Scene(|s, value| concrete(s, |c| c.density = value))],
    ),
    of(
        "parameter:nose-factor",
        "the nose factor is always {}",
        Parameter::Value(0.3),
        &[Change::Scene(|s, value| concrete(s, |c| c.nose_factor = value))],
    ),
    of(
        "parameter:k",
        "k is always {}",
        Parameter::Value(0.3),
        &[Change::Scene(|s, value| concrete(s, |c| c.crater_ratio = value))],
    ),
    of(
        "parameter:k",
        "k is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| concrete(s, |c| c.crater_ratio *= f))],
    ),
    of(
        "parameter:k",
        "k is {} too great",
        Parameter::Offset,
        &[Change::Scene(|s, more| concrete(s, |c| c.crater_ratio += more))],
    ),
    of(
        "input-rounded",
        "k is rounded to a multiple of {}",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| concrete(s, |c| c.crater_ratio = to_grain(c.crater_ratio, grain)))],
    ),
    of(
        "input-rounded",
        "k is cut to a multiple of {}",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| concrete(s, |c| c.crater_ratio = (c.crater_ratio / grain).floor() * grain))],
    ),
    of(
        "parameter:thickness",
        "the thickness is {} times the right one",
        Parameter::Factor,
        &[Change::Scene(|s, f| s.thickness = s.thickness.map(|thickness| f * thickness))],
    ),
    of(
        "input-rounded",
        "the thickness is rounded to a multiple of {} m",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, grain| s.thickness = s.thickness.map(|thickness| to_grain(thickness, grain)))],
    ),
    of(
        "parameter:crater-stiffness",
        "c is {} times the right one where it is stated",
        Parameter::Factor,
        &[Change::Scene(|s, f| {
            concrete(s, |c| {
                if let CraterStiffness::Given(stiffness) = &mut c.crater_stiffness {
                    *stiffness *= f;
                }
            });
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "the crater stiffness c is {} times the right one",
        Parameter::Factor,
        &[Change::Problem(|p, f| {
            if let Some(crater) = p.crater {
                p.stages[crater].stiffness *= f;
            }
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "a stated crater stiffness is ignored: the continuous one is used",
        Parameter::None,
        &[Change::Scene(|s, _| concrete(s, |c| c.crater_stiffness = CraterStiffness::Continuous))],
    ),
    of(
        "parameter:crater-stiffness",
        "c is continued with the impact speed: c = (P + Q V0²)/(k d)",
        Parameter::None,
        &[Change::Scene(|s, _| {
            set_crater(s, |tunnel, depth, speed, _| (tunnel.static_force + tunnel.drag * speed * speed) / depth);
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "c is P/(k d) where the continuous one means rest in the crater",
        Parameter::None,
        &[Change::Scene(|s, _| {
            set_crater(s, |tunnel, depth, speed, mass| {
                let right = Stage::continuous_crater(depth, tunnel, mass, speed).stiffness;
                if right * depth >= tunnel.static_force { right } else { tunnel.static_force / depth }
            });
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "c is that without drag: c = P/(k d)",
        Parameter::None,
        &[Change::Scene(|s, _| set_crater(s, |tunnel, depth, _, _| tunnel.static_force / depth))],
    ),
    of(
        "parameter:crater-stiffness",
        "c is continued with a wrong sign: M (P + Q V0²)/(k d (M - k d Q))",
        Parameter::None,
        &[Change::Scene(|s, _| {
            set_crater(s, |tunnel, depth, speed, mass| {
                (tunnel.static_force + tunnel.drag * speed * speed) / (1.0 - depth * tunnel.drag / mass) / depth
            });
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "c is continued without V0: c = M P/(k d (M + k d Q))",
        Parameter::None,
        &[Change::Scene(|s, _| {
            set_crater(s, |tunnel, depth, _, mass| tunnel.static_force / (1.0 + depth * tunnel.drag / mass) / depth);
        })],
    ),
    of(
        "parameter:crater-stiffness",
        "c is {} times the continuous one where none is stated",
        Parameter::Factor,
        &[Change::Scene(|s, f| {
            set_crater(s, |tunnel, depth, speed, mass| {
                f * Stage::continuous_crater(depth, tunnel, mass, speed).stiffness
            });
        })],
    ),
    of(
        "parameter:criterion",
        "the criterion is ignored: the exit is the far side",
        Parameter::None,
        &[Change::Scene(|s, _| s.criterion = Criterion::FullDepth)],
    ),
    of(
        "parameter:criterion",
        "the criterion is always ndrc",
        Parameter::None,
        &[Change::Scene(|s, _| s.criterion = Criterion::Ndrc)],
    ),
    of(
        "parameter:criterion",
        "the line of the criterion ndrc, H/d = 1.32 + 1.24 y, is taken from H/d = 1.35 on, not from y = 1.35 on",
        Parameter::None,
        &[Change::Scene(|s, _| {
            let diameter = s.concrete().map(|c| c.diameter);
            let ndrc = s.thickness.zip(diameter).filter(|_| s.criterion == Criterion::Ndrc);
            if let Some((thickness, diameter)) = ndrc
                && thickness > 1.35 * diameter
            {
                let depth_ratio = (thickness / diameter - 1.32) / 1.24;
                s.thickness = Some(diameter * perforated_thickness_ratio(depth_ratio));
            }
        })],
    ),
    of(
        "parameter:criterion",
        "the criterion ndrc is that of scabbing: H/d = 7.91 y - 5.06 y² up to y = 0.65, and 2.12 + 1.36 y beyond",
        Parameter::None,
        &[Change::Scene(|s, _| {
            let diameter = s.concrete().map(|c| c.diameter);
            if let Some((thickness, diameter)) = s.thickness.zip(diameter).filter(|_| s.criterion == Criterion::Ndrc) {
                // Source: Kennedy (1976), the modified NDRC formula of scabbing.
                let ratio = thickness / diameter;
                let (a, b) = (7.91, 5.06);
                let is_thin = ratio <= 0.65 * (a - 0.65 * b);
                let y =
                    if is_thin { 2.0 * ratio / (a + (a * a - 4.0 * b * ratio).sqrt()) } else { (ratio - 2.12) / 1.36 };
                s.thickness = Some(diameter * perforated_thickness_ratio(y));
            }
        })],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is that of at most {} Pa",
        Parameter::Value(3e7),
        &[Change::Scene(|s, n| concrete(s, |c| set_strength(c, c.strength.min(n))))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is that of at least {} Pa",
        Parameter::Value(3e7),
        &[Change::Scene(|s, n| concrete(s, |c| set_strength(c, c.strength.max(n))))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is that of {} Pa more",
        Parameter::Value(8e6),
        &[Change::Scene(|s, n| concrete(s, |c| set_strength(c, c.strength + n)))],
    ),
    of(
        "parameter:S",
        "S by Eq. 14 is that of {} Pa less",
        Parameter::Value(8e6),
        &[Change::Scene(|s, n| concrete(s, |c| set_strength(c, c.strength - n)))],
    ),
    of(
        "input-rounded",
        "S is rounded to a multiple of {}",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, n| concrete(s, |c| c.static_factor = to_grain(c.static_factor, n)))],
    ),
    of(
        "input-rounded",
        "S by Eq. 14 is rounded to a multiple of {}",
        Parameter::OneOf(GRAINS),
        &[Change::Scene(|s, n| {
            concrete(s, |c| {
                if c.follows_eq14 {
                    c.static_factor = to_grain(c.static_factor, n);
                }
            });
        })],
    ),
    of(
        "input-clipped",
        "the strength is at most {} Pa",
        Parameter::Value(3e7),
        &[Change::Scene(|s, n| concrete(s, |c| c.strength = c.strength.min(n)))],
    ),
    of(
        "input-clipped",
        "the strength is at least {} Pa",
        Parameter::Value(3e7),
        &[Change::Scene(|s, n| concrete(s, |c| c.strength = c.strength.max(n)))],
    ),
    of(
        "input-clipped",
        "the diameter is at most {} m",
        Parameter::Value(0.05),
        &[Change::Scene(|s, n| concrete(s, |c| c.diameter = c.diameter.min(n)))],
    ),
    of(
        "input-clipped",
        "the diameter is at least {} m",
        Parameter::Value(0.05),
        &[Change::Scene(|s, n| concrete(s, |c| c.diameter = c.diameter.max(n)))],
    ),
    of(
        "input-clipped",
        "the density is at most {} kg/m³",
        Parameter::Value(2e3),
        &[Change::Scene(|s, n| concrete(s, |c| c.density = c.density.min(n)))],
    ),
    of(
        "input-clipped",
        "the density is at least {} kg/m³",
        Parameter::Value(2e3),
        &[Change::Scene(|s, n| concrete(s, |c| c.density = c.density.max(n)))],
    ),
    of(
        "input-clipped",
        "S is at most {}",
        Parameter::Value(9.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.static_factor = c.static_factor.min(n)))],
    ),
    of(
        "input-clipped",
        "S is at least {}",
        Parameter::Value(9.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.static_factor = c.static_factor.max(n)))],
    ),
    of(
        "input-clipped",
        "the nose factor is at most {}",
        Parameter::Value(0.3),
        &[Change::Scene(|s, n| concrete(s, |c| c.nose_factor = c.nose_factor.min(n)))],
    ),
    of(
        "input-clipped",
        "the nose factor is at least {}",
        Parameter::Value(0.3),
        &[Change::Scene(|s, n| concrete(s, |c| c.nose_factor = c.nose_factor.max(n)))],
    ),
    of(
        "input-clipped",
        "B is at most {}",
        Parameter::Value(1.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.inertia_factor = c.inertia_factor.min(n)))],
    ),
    of(
        "input-clipped",
        "B is at least {}",
        Parameter::Value(1.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.inertia_factor = c.inertia_factor.max(n)))],
    ),
    of(
        "input-clipped",
        "k is at most {}",
        Parameter::Value(2.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.crater_ratio = c.crater_ratio.min(n)))],
    ),
    of(
        "input-clipped",
        "k is at least {}",
        Parameter::Value(2.0),
        &[Change::Scene(|s, n| concrete(s, |c| c.crater_ratio = c.crater_ratio.max(n)))],
    ),
    of(
        "parameter:k",
        "the crater is no deeper than the target is thick",
        Parameter::None,
        &[Change::Scene(|s, _| {
            let thickness = s.thickness.unwrap_or(f64::INFINITY);
            concrete(s, |c| c.crater_ratio = c.crater_ratio.min(thickness / c.diameter));
        })],
    ),
    of(
        "parameter:k",
        "a target that is no thicker than the crater is deep has no crater",
        Parameter::None,
        &[Change::Scene(|s, _| {
            let thickness = s.thickness.unwrap_or(f64::INFINITY);
            concrete(s, |c| {
                if thickness <= c.crater_depth() {
                    c.crater_ratio = 0.0;
                }
            });
        })],
    ),
    of(
        "exit-misplaced",
        "the exit lies {} diameters too deep",
        Parameter::Factor,
        &[Change::OfScene(|concrete, p, n| p.exit_depth += n * concrete.diameter)],
    ),
    of(
        "stage-end-misplaced",
        "the crater ends {} diameters too deep, with its stiffness as it is",
        Parameter::Factor,
        &[Change::OfScene(|concrete, p, n| {
            if let Some(crater) = p.crater {
                p.stages[crater].end += n * concrete.diameter;
            }
        })],
    ),
];
