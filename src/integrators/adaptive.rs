//! `adaptive`: an explicit or an implicit method for each stage, chosen from its coefficients, with the reason.
//!
//! A stage is stiff when a fast transient is over long before the stage is, and an explicit method must still resolve
//! it. With `F = p + s x + r V + q V²` and r, q >= 0 the velocity relaxes at the rate `(r + 2 q V)/M`.
//!
//! - Where the static force resists, `p + s x >= 0`, it also stops: `V F_V <= 2 F`, hence `∫ F_V/M dt <= 2 ln(V0/V)`
//!   and rest comes inside the transient. Such a stage is never stiff, viscous or not, and stays explicit.
//! - Where it drives, the velocity relaxes to the terminal one and stays there for the rest of the stage. With
//!
//! ```text
//! terminal velocity  V_t = 2 f/(r + sqrt(r² + 4 q f)),  f = -(p + s x0)
//! fast rate          l = (r + 2 q V_t)/M
//! stiffness          Z = (l D - V)/V_t,  D the distance to the stage's end, the exit or the place where the drive is spent
//! ```
//!
//! Z counts the relaxation times left in the stage once the transient is over, at the least: the drive fades and the
//! projectile slows. An explicit method of order 5 takes one step of six evaluations for every three of them.

use super::diffsol::Scheme;
use super::flight::Course;
use super::outcome::Detail;
use crate::physics::{Problem, Stage, State};

/// Stiffness Z above which a stage is solved by the implicit method.
///
/// `tsit45` takes about 2.4 Z force evaluations, `bdf` takes 70 to 400 whatever Z, each three times as dear for its
/// linear algebra and at the same rtol with a larger error. Both take the same time at Z = 60 (rtol 1e-6), 250 (1e-10)
/// and 400 (1e-12).
pub const STIFFNESS_LIMIT: f64 = 200.0;

/// Most stages whose choice is noted; a table has thousands.
const EXPLAINED_MAX: usize = 64;

/// The explicit method.
pub(super) const EXPLICIT: Scheme = Scheme::Tsit45;

/// The implicit method: of the three, the one with the fewest force evaluations at every tolerance below 1e-4.
pub(super) const IMPLICIT: Scheme = Scheme::Bdf;

/// The method chosen for a stage, and what it was chosen by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The method.
    pub scheme: Scheme,
    /// Stiffness Z of a stage that drives; `None` where the static force resists, which needs no number.
    pub stiffness: Option<f64>,
}

impl Choice {
    /// The choice for a stage of `problem` entered at `depth` (m) with `velocity` (m/s).
    ///
    /// From the coefficients alone; of a law of its own, from its force and slopes there.
    pub fn of(problem: &Problem, stage: usize, depth: f64, velocity: f64) -> Self {
        let distance = problem.limit_of(stage) - depth;
        if problem.laws.of(stage).is_some_and(|law| law.force(depth, 0.0) >= 0.0) {
            return Self { scheme: EXPLICIT, stiffness: None };
        }
        let law = &problem.linear(stage, State { time: 0.0, depth, velocity });
        match stiffness(law, problem.mass, depth, velocity, distance) {
            Some(z) if z > STIFFNESS_LIMIT => Self { scheme: IMPLICIT, stiffness: Some(z) },
            z => Self { scheme: EXPLICIT, stiffness: z },
        }
    }

    /// The method for the present stage of `course`, which notes the reason.
    pub(super) fn note(course: &mut Course<'_>) -> Scheme {
        let choice = Self::of(course.problem, course.stage, course.state.depth, course.state.velocity);
        if course.detail >= Detail::Events && course.stage < EXPLAINED_MAX {
            course.notes.push(choice.explain(course.stage));
        }
        choice.scheme
    }

    /// The choice as a sentence about stage `stage`.
    pub fn explain(&self, stage: usize) -> String {
        let name = self.scheme.name();
        match self.stiffness {
            None => format!("stage {stage} by {name}: its static force resists, and such a stage is never stiff"),
            Some(z) => {
                let verdict = if self.scheme.is_implicit() { "and is stiff" } else { "but is not stiff" };
                let limit = format!("after the transient (limit {STIFFNESS_LIMIT})");
                format!("stage {stage} by {name}: it drives {verdict}, with {z:.3e} relaxation times {limit}")
            }
        }
    }
}

/// Stiffness Z; `None` where the static force resists.
fn stiffness(law: &Stage, mass: f64, depth: f64, velocity: f64, distance: f64) -> Option<f64> {
    let drive = -(law.static_force + law.stiffness * depth);
    if drive <= 0.0 {
        return None;
    }
    let distance = if law.stiffness > 0.0 { distance.min(drive / law.stiffness) } else { distance };
    let terminal = 2.0 * drive / (law.viscosity + (law.viscosity * law.viscosity + 4.0 * law.drag * drive).sqrt());
    if terminal.is_infinite() {
        return Some(0.0);
    }
    let rate = (law.viscosity + 2.0 * law.drag * terminal) / mass;
    Some(((rate * distance - velocity) / terminal).max(0.0))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::integrators::{Diffsol, Integrator};
    use crate::physics::Outcome;
    use crate::testing::{of_stages, stage};

    fn one_stage(exit_depth: f64, stage: Stage) -> Problem {
        of_stages(1.0, 1.0, exit_depth, &[stage])
    }

    #[test]
    #[ignore = "prints the evaluations from which the limit is chosen"]
    fn measure_evaluations() {
        for rtol in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
            for viscosity in [10.0, 30.0, 100.0, 300.0] {
                let problem = one_stage(4.0, stage(-viscosity, viscosity / 10.0, viscosity, 0.0, f64::INFINITY));
                print!("{rtol:e} Z = {:7.1?}: ", Choice::of(&problem, 0, 0.0, 1.0).stiffness);
                for scheme in Scheme::ALL {
                    let flight = Diffsol::new(scheme, rtol).solve(&problem, Detail::End).unwrap();
                    print!(" {} {}", scheme.name(), flight.cost.force_evaluations);
                }
                println!();
            }
        }
    }

    #[test]
    fn a_stiff_stage_costs_a_tenth_of_the_explicit_evaluations_at_most() {
        // Weight through a viscous layer: the drive fades over x, and it leaves at a tenth of its speed.
        let stiff = one_stage(9.0, stage(-1000.0, 100.0, 1000.0, 0.0, f64::INFINITY));
        let explicit = Diffsol::new(Scheme::Tsit45, 1e-6).solve(&stiff, Detail::Events).unwrap().cost;
        let adaptive = Diffsol::adaptive(1e-6).solve(&stiff, Detail::Events).unwrap();
        let evaluations = adaptive.cost.force_evaluations;
        assert!(10 * evaluations <= explicit.force_evaluations, "{evaluations} against {explicit:?}");
        assert_eq!(adaptive.outcome, Outcome::Perforated);
        // Overdamped closed form, to 30 digits: fast and slow rate from l² - 1000 l + 100 = 0.
        assert!((adaptive.end.velocity - 0.100_010_002_000_500_14).abs() < 1e-9, "{}", adaptive.end);
        assert!((adaptive.end.time / 23.023_548_214_4 - 1.0).abs() < 1e-5, "{}", adaptive.end);
        let is_said = adaptive.notes.iter().any(|note| note.contains("bdf") && note.contains("stiff"));
        assert!(is_said, "{:?}", adaptive.notes);
    }

    #[test]
    fn a_stage_that_only_resists_stays_explicit_however_viscous() {
        // Rest comes inside the transient.
        let viscous = one_stage(9.0, stage(10.0, 100.0, 1000.0, 0.0, f64::INFINITY));
        let flight = Diffsol::adaptive(1e-6).solve(&viscous, Detail::Events).unwrap();
        let explicit = Diffsol::new(Scheme::Tsit45, 1e-6).solve(&viscous, Detail::Events).unwrap();
        assert_eq!(flight.cost, explicit.cost);
        assert_eq!(flight.end, explicit.end);
        assert!(flight.notes.iter().any(|note| note.contains("never stiff")), "{:?}", flight.notes);
        // r/M = 1000/s costs nothing: the tunnel scene without any viscosity takes 69 evaluations.
        assert!(explicit.cost.force_evaluations <= 100, "{:?}", explicit.cost);
        assert_eq!(flight.outcome, Outcome::Stopped);
    }

    #[test]
    fn each_stage_gets_the_method_that_suits_it() {
        let (before, behind) = (stage(0.1, 0.0, 0.0, 0.0, 0.5), stage(1e-4, 0.0, 0.0, 0.0, f64::INFINITY));
        let problem = of_stages(1.0, 1.0, 9.5, &[before, stage(-1000.0, 100.0, 1000.0, 0.0, 9.0), behind]);
        let flight = Diffsol::adaptive(1e-8).solve(&problem, Detail::Events).unwrap();
        let named: Vec<_> = flight.notes.iter().filter_map(|note| note.split(' ').nth(3)).collect();
        assert_eq!(named, ["tsit45:", "bdf:", "tsit45:"]);
        let explicit = Diffsol::new(Scheme::Tsit45, 1e-8).solve(&problem, Detail::Events).unwrap();
        let off = (flight.exit_margin.unwrap() - explicit.exit_margin.unwrap()).abs();
        assert!(off < flight.exit_margin_error.unwrap(), "{off:e}");
    }

    #[test]
    fn a_drive_without_resistance_to_motion_is_not_stiff() {
        let problem = one_stage(5.0, stage(-10.0, 0.0, 0.0, 0.0, f64::INFINITY));
        assert_eq!(Choice::of(&problem, 0, 0.0, 1.0), Choice { scheme: EXPLICIT, stiffness: Some(0.0) });
        let drag = one_stage(5000.0, stage(-10.0, 0.0, 0.0, 10.0, f64::INFINITY));
        assert_eq!(Choice::of(&drag, 0, 0.0, 1.0).scheme, IMPLICIT);
    }

    #[test]
    fn stiffness_is_the_relaxation_times_left_after_the_transient() {
        // By hand: terminal speed Vt, rate (r + 2 q Vt)/M, Z = (rate distance - V)/Vt.
        for (law, mass, depth, velocity, distance, stiffness) in [
            (stage(-1000.0, 100.0, 1000.0, 0.0, f64::INFINITY), 1.0, 0.0, 1.0, 9.0, Some(8999.0)),
            (stage(-100.0, 0.0, 0.0, 4.0, f64::INFINITY), 2.0, 0.0, 4.0, 3.0, Some(11.2)),
            (stage(-10.0, 0.0, 3.0, 1.0, f64::INFINITY), 0.5, 0.0, 1.0, 1.5, Some(10.0)),
            // The drive is spent after 10/2 metres, however far the stage goes on.
            (stage(-12.0, 2.0, 10.0, 0.0, f64::INFINITY), 1.0, 1.0, 20.0, 7.0, Some(30.0)),
            (stage(-1.0, 0.0, 1.0, 0.0, f64::INFINITY), 1.0, 0.0, 5.0, 1.0, Some(0.0)),
            (stage(-1.0, 0.0, 0.0, 0.0, f64::INFINITY), 1.0, 0.0, 5.0, 1.0, Some(0.0)),
            (stage(1.0, 0.0, 1e9, 0.0, f64::INFINITY), 1.0, 0.0, 5.0, 1.0, None),
        ] {
            assert_eq!(super::stiffness(&law, mass, depth, velocity, distance), stiffness, "{law:?}");
        }
    }

    #[test]
    fn the_distance_counts_from_where_the_stage_is_entered_and_the_limit_itself_is_explicit() {
        // Terminal velocity 1 m/s, rate 128/s: Z = 128 D - 1, which is 200 for a distance of 201/128 m behind 1 m.
        let exit_depth: f64 = 1.0 + 201.0 / 128.0;
        for (exit_depth, scheme, words) in [
            (exit_depth, EXPLICIT, "tsit45: it drives but is not stiff"),
            (exit_depth.next_up(), IMPLICIT, "bdf: it drives and is stiff"),
        ] {
            let problem = one_stage(exit_depth, stage(-128.0, 0.0, 128.0, 0.0, f64::INFINITY));
            let choice = Choice::of(&problem, 0, 1.0, 1.0);
            assert_eq!(choice.scheme, scheme);
            assert!((choice.stiffness.unwrap() - STIFFNESS_LIMIT).abs() < 1e-12, "{choice:?}");
            let shown = choice.explain(3);
            assert!(shown.starts_with(&format!("stage 3 by {words}, with 2.000e2 relaxation times")), "{shown}");
        }
    }
}
