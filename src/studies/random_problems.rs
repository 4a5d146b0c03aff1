//! Random problems of every kind of stage, from a seed.

use serde::Deserialize;

use super::random::Random;
use crate::integrators::{Detail, Taylor};
use crate::physics::force_table::{ForceTable, Row};
use crate::physics::{Problem, Stage};

/// What stages a random problem has, and where it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A crater that stops the projectile, or is left through its far side.
    Crater,
    /// A crater and a tunnel, with drag or without.
    Tunnel,
    /// One stage with p, s and q.
    SpringAndDrag,
    /// One stage with p, r and at times q.
    Viscous,
    /// One stage with s, r and at times p.
    ViscousSpring,
    /// A stage that drives against drag or viscosity, and at times one that resists.
    Driven,
    /// Three to five stages without viscosity: forces, springs, drag, gaps.
    Several,
    /// Three to five stages, most with viscosity.
    SeveralViscous,
    /// A table of 2 to 40 rows, whose force rises and falls and often drives, and a force behind it.
    Table,
}

/// Numbers from which forces are made.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Mass (kg).
    pub mass: f64,
    /// Speed (m/s).
    pub speed: f64,
    /// Length (m).
    pub length: f64,
}

impl Scale {
    /// 10 g to 100 kg, 1 to 1000 m/s, 1 cm to 10 m.
    pub fn draw(random: &mut Random) -> Self {
        Self {
            mass: random.log_uniform(1e-2, 1e2),
            speed: random.log_uniform(1.0, 1e3),
            length: random.log_uniform(1e-2, 1e1),
        }
    }

    /// A stage of shares of `M V²/L`: static force, force of the spring at L, of viscosity and of drag at V.
    pub fn stage(&self, [p, s, r, q]: [f64; 4]) -> Stage {
        let &Self { mass, speed, length } = self;
        let force = mass * speed * speed / length;
        Stage {
            static_force: p * force,
            stiffness: s * force / length,
            viscosity: r * force / speed,
            drag: q * force / speed / speed,
            end: f64::INFINITY,
        }
    }
}

impl Kind {
    /// A problem of this kind. Half of those that can stop do, the others perforate, some with an end of a stage as the
    /// far side; the far side lies a thousandth to the whole of the depth of rest away from it. `None` where the speed only
    /// dies out.
    pub fn draw(self, random: &mut Random) -> Option<Problem> {
        let scale = Scale::draw(random);
        let share = |random: &mut Random| random.log_uniform(0.1, 3.0);
        let some = |random: &mut Random, chance: f64| if random.chance(chance) { share(random) } else { 0.0 };
        let length = scale.length;
        let mut stages = Vec::new();
        match self {
            Self::Crater => {
                let spring = random.log_uniform(0.1, 10.0);
                let rest = length / spring.sqrt();
                stages.push(scale.stage([0.0, spring, 0.0, 0.0]).until(rest * random.log_uniform(1.05, 3.0)));
                stages.push(scale.stage([share(random), 0.0, 0.0, some(random, 0.8)]));
            }
            Self::Tunnel => {
                let depth = random.log_uniform(0.05, 1.0);
                let spring = random.uniform(0.05, 0.8) / depth / depth;
                stages.push(scale.stage([0.0, spring, 0.0, 0.0]).until(depth * length));
                stages.push(scale.stage([share(random), 0.0, 0.0, some(random, 0.8)]));
            }
            Self::SpringAndDrag => {
                stages.push(scale.stage([some(random, 0.7), share(random), 0.0, share(random)]));
            }
            Self::Viscous => {
                stages.push(scale.stage([share(random), 0.0, share(random), some(random, 0.5)]));
            }
            Self::ViscousSpring => {
                stages.push(scale.stage([some(random, 0.5), share(random), share(random), 0.0]));
            }
            Self::Driven => {
                let [r, q] = if random.chance(0.5) { [share(random), 0.0] } else { [0.0, share(random)] };
                let drive = scale.stage([-share(random), 0.0, r, q]);
                stages.push(drive.until(length * share(random)));
                stages.push(scale.stage([share(random), 0.0, 0.0, some(random, 0.5)]));
            }
            Self::Table => {
                let rows = Self::rows(random, &scale);
                stages.extend(ForceTable::new(&rows).ok()?.stages(0.0));
                stages.push(scale.stage([share(random), 0.0, 0.0, 0.0]));
            }
            Self::Several | Self::SeveralViscous => {
                let count = 3 + random.below(3);
                let mut end = 0.0;
                for index in 0..count {
                    end += length * random.log_uniform(0.03, 0.5);
                    let r = if self == Self::SeveralViscous { some(random, 0.7) } else { 0.0 };
                    let [p, s, q] = match random.below(7) {
                        0 => [share(random), 0.0, 0.0],
                        1 => [0.0, share(random), 0.0],
                        2 => [0.0, 0.0, share(random)],
                        3 => [share(random), 0.0, share(random)],
                        4 => [share(random), share(random), share(random)],
                        5 => [-0.3 * share(random), 0.0, share(random)],
                        _ => [0.0; 3],
                    };
                    stages.push(if index + 1 < count {
                        scale.stage([p, s, r, q]).until(end)
                    } else {
                        scale.stage([share(random), s, r, q])
                    });
                }
            }
        }
        let problem = match self {
            Self::Crater | Self::Tunnel => {
                Problem::crater_and_tunnel(scale.mass, scale.speed, Some(stages[0]), stages[1])
            }
            _ => Problem::of_stages(scale.mass, scale.speed, stages),
        };
        let rest = Taylor::default().solve_in(&problem, Detail::End).ok()?.end.depth;
        let away = random.log_uniform(1e-3, 1.0);
        let ends: Vec<f64> = problem.stages.iter().map(|stage| stage.end).filter(|end| *end < rest).collect();
        let exit = if !ends.is_empty() && random.chance(0.15) {
            ends[random.below(ends.len())]
        } else if random.chance(0.5) {
            rest * (1.0 + away)
        } else {
            rest * (1.0 - 0.95 * away)
        };
        Some(problem.with_exit(exit))
    }

    /// Rows of a table from the face on: steps of all lengths, forces of either sign, some of them zero or as before.
    fn rows(random: &mut Random, scale: &Scale) -> Vec<Row> {
        let force = scale.mass * scale.speed * scale.speed / scale.length;
        let mean = random.uniform(-0.1, 0.5);
        let mut depth = 0.0;
        let mut last = 0.0;
        let mut row = |random: &mut Random| {
            last = match random.below(8) {
                0 => 0.0,
                1 => last,
                _ => force * (mean + random.uniform(-1.0, 1.0) * random.log_uniform(0.01, 1.0)),
            };
            let row = Row { at: depth, force: last };
            depth += scale.length * random.log_uniform(1e-3, 0.3);
            row
        };
        (0..2 + random.below(39)).map(|_| row(random)).collect()
    }
}
