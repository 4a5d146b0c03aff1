//! Which problems must have the same solution, whatever it is? The same one in other units, and the return from its end.

use crate::integrators::Flight;
use crate::physics::{Laws, Problem, Stage, Stages, Target};

/// Units of length, mass and time, as factors: a metre becomes `length` of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Factor of lengths.
    pub length: f64,
    /// Factor of masses.
    pub mass: f64,
    /// Factor of times.
    pub time: f64,
}

/// `problem` in other units: depths of its solution come out times `length`, times times `time`.
pub fn in_units(problem: &Problem, Units { length, mass, time }: Units) -> Problem {
    let force = mass * length / (time * time);
    Problem {
        mass: problem.mass * mass,
        impact_speed: problem.impact_speed * length / time,
        exit_depth: problem.exit_depth * length,
        stages: problem
            .stages
            .iter()
            .map(|s| Stage {
                static_force: s.static_force * force,
                stiffness: s.stiffness * force / length,
                viscosity: s.viscosity * mass / time,
                drag: s.drag * mass / length,
                end: s.end * length,
            })
            .collect(),
        ..problem.clone()
    }
}

/// The return from the end of `there`, which left with velocity. `F` is even in V for r = 0, so with y = x_end - x the
/// return is a motion under -F, in which drag adds energy. It must leave at y = x_end with V0 after the same time.
///
/// `None` where there is no such motion: viscosity, which is not even in V, or an end at rest.
pub fn reversed(problem: &Problem, there: &Flight) -> Option<Problem> {
    let viscous = problem.stages.iter().any(|law| law.viscosity != 0.0);
    if viscous || there.outcome.is_stop() || there.end.velocity <= 0.0 {
        return None;
    }
    let far = there.end.depth;
    let stages: Stages = (0..=there.stage)
        .rev()
        .map(|index| {
            let law = problem.stages[index];
            Stage {
                // -(p + s (far - y) + q U²) in the reversed coordinate y.
                static_force: -(law.static_force + law.stiffness * far),
                drag: -law.drag,
                end: if index == 0 { f64::INFINITY } else { far - problem.start_of(index) },
                ..law
            }
        })
        .collect();
    Some(Problem {
        mass: problem.mass,
        impact_speed: there.end.velocity,
        exit_depth: far,
        stages,
        crater: None,
        target: Target::Stages,
        laws: Laws::none(),
    })
}
