//! Do random scenes cover what they say that they cover?

use super::super::claim::Found;
use super::Subject;
use super::edges::Violations;
use crate::physics::{CraterStiffness, Scene};
use crate::studies::{critical_velocity, extreme_scenes, random_scenes};

check! {
    /// `scenes` scenes of each generator: tenths of the range of I, N, H/d, k, d and of a given c, each on a scale of
    /// logarithms, that hold less than two fifths of their share, numbers out of range, and edges that are aimed at too
    /// seldom.
    Generators {
        /// How many.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        scenes: usize,
    } in Random, "violations", counting generators, compares nothing;
}

/// I, N, H/d, k, d and c over P/(k d) of `scene` by their definitions; `None` for what it does not have.
fn groups(scene: &Scene) -> Option<[Option<f64>; 6]> {
    let c = scene.concrete()?;
    let (d, force) = (c.diameter, c.static_factor * c.strength);
    let speed = scene.velocity?;
    let static_force = std::f64::consts::FRAC_PI_4 * d * d * force;
    let given = match c.crater_stiffness {
        CraterStiffness::Given(stiffness) => Some(stiffness * c.crater_ratio * d / static_force),
        CraterStiffness::Continuous => None,
    };
    let drag = c.nose_factor * c.inertia_factor * c.density;
    Some([
        Some(scene.mass / d * (speed / d) / force * (speed / d)),
        (drag > 0.0).then(|| scene.mass / d / d / d / drag),
        scene.thickness.map(|thickness| thickness / d),
        Some(c.crater_ratio).filter(|ratio| *ratio > 0.0),
        Some(d),
        given,
    ])
}

const NAMES: [&str; 6] = ["I", "N", "H/d", "k", "d", "given c"];

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn generators(&Generators { scenes: count }: &Generators, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let seed = subject.context.seed;
    let mut generator = random_scenes::Generator::new(seed, "coverage");
    let plain: Vec<Scene> = (0..count).map(|_| generator.next_scene()).collect();
    let extreme = |first: u64| (0..count as u64).map(move |index| extreme_scenes::scene(seed, 2 * index + first));
    let drawn: Vec<Scene> = extreme(0).collect();
    // What each says of itself: ranges, and the shares of scenes that have the number.
    let plain_ranges = [(1e-3, 1e3), (0.1, 1e6), (0.1, 30.0), (0.1, 10.0), (1e-3, 1.0), (0.25, 4.0)];
    let drawn_ranges = [(1e-9, 1e6), (1e-3, 1e12), (1e-3, 1e3), (1e-8, 10.0), (1e-6, 1e3), (1e-2, 1e2)];
    let sources = [
        ("random", &plain, plain_ranges, [1.0, 0.9, 0.7, 1.0, 1.0, 0.3]),
        ("extreme", &drawn, drawn_ranges, [1.0, 0.9, 0.8, 0.95, 1.0, 0.285]),
    ];
    for (source, scenes, ranges, shares) in sources {
        for (index, ((low, high), share)) in ranges.into_iter().zip(shares).enumerate() {
            let name = NAMES[index];
            let values: Vec<f64> = scenes.iter().filter_map(|scene| groups(scene)?[index]).collect();
            let has = values.len() as f64 / count as f64;
            seen.expect((has - share).abs() <= 0.06, || format!("{has} of the {source} scenes have {name}"));
            let mut tenths = [0_usize; 10];
            for value in &values {
                let place = (value / low).ln() / (high / low).ln();
                seen.expect((-1e-9..=1.0 + 1e-9).contains(&place), || format!("{name} = {value} of {source} scenes"));
                tenths[((10.0 * place) as usize).min(9)] += 1;
            }
            let least = 0.4 * values.len() as f64 / 10.0;
            seen.expect(tenths.iter().all(|tenth| *tenth as f64 >= least), || {
                format!("{name} of {source} scenes by tenths of its range: {tenths:?}")
            });
        }
    }
    let mut aimed = [0_usize; 7];
    for scene in extreme(1) {
        let (Some(c), Some(speed), Some([impact, _, ratio, _, _, given])) =
            (scene.concrete(), scene.velocity, groups(&scene))
        else {
            continue;
        };
        let is_near = |value: f64, place: f64| (value / place - 1.0).abs() < 0.11;
        let depth = c.crater_ratio * c.diameter;
        let force = std::f64::consts::FRAC_PI_4 * c.diameter * c.diameter * c.static_factor * c.strength;
        let stiffness = given.unwrap_or(1.0) * force / depth;
        let edges = [
            critical_velocity::exact(&scene).is_ok_and(|critical| is_near(speed, critical)),
            scene.thickness.is_some_and(|thickness| is_near(thickness, depth)),
            is_near(speed, (stiffness * depth * depth / scene.mass).sqrt()),
            impact.is_some_and(|impact| impact < 0.9e-9),
            ratio.is_some_and(|ratio| ratio < 0.9e-3),
            scene.mass.to_bits().trailing_zeros() >= 52,
            given.is_some_and(|given| !(0.9e-2..=1.1e2).contains(&given)),
        ];
        for (sum, edge) in aimed.iter_mut().zip(edges) {
            *sum += usize::from(edge);
        }
    }
    // Half of the share of the edges that do so, of eight.
    let least = [0.19, 0.11, 0.11, 0.05, 0.05, 0.06, 0.04];
    for (index, (sum, least)) in aimed.into_iter().zip(least).enumerate() {
        let share = sum as f64 / count as f64;
        seen.expect(share >= least, || format!("edge {index} is aimed at in {share} of the scenes"));
    }
    Ok(())
}
