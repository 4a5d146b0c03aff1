//! What no formula is needed for: energy, reversal, similarity, composition.

use super::super::claim::{Evidence, Measurement, NotMeasured};
use super::{Subject, fly};
use crate::integrators::{Detail, Flight};
use crate::physics::{Problem, Stage, Stages, Target};
use crate::studies::error::{is_fixed, value_of};
use crate::studies::quantity::Quantity;
use crate::studies::relations::{Units, in_units, way_back};

/// Kinetic energy lost against work done, at every row of the trajectory; worst residual over M V0²/2.
///
/// The work between two rows is `∫ F dx` along the path that starts from the earlier row's state, integrated here by
/// [`work`]: nothing of the method's own integration enters.
pub(super) fn energy_balance(subject: &Subject<'_>) -> Result<Measurement, NotMeasured> {
    let problem = &subject.problem;
    if problem.stages.iter().any(|s| s.viscosity != 0.0) {
        return Err(NotMeasured::skip("the work of a viscous force is not smooth in x at rest"));
    }
    let flight = subject.fly(&subject.method(None)?, Detail::Trajectory)?;
    let scale = 0.5 * problem.mass * problem.impact_speed * problem.impact_speed;
    let mut residual = 0.0_f64;
    let mut spent = 0.0;
    let mut points = Vec::with_capacity(flight.trajectory.len());
    for rows in flight.trajectory.windows(2) {
        let (a, b) = (rows[0], rows[1]);
        let way = b.state.depth - a.state.depth;
        if way <= 0.0 {
            continue;
        }
        let law = &problem.stages[stage_at(problem, a.state.depth + 0.5 * way)];
        spent += work(law, problem.mass, a.state.depth, way, a.state.velocity);
        let kinetic =
            0.5 * problem.mass * (problem.impact_speed - b.state.velocity) * (problem.impact_speed + b.state.velocity);
        residual = worse(residual, (kinetic - spent).abs() / scale);
        points.push((b.state.depth, (kinetic - spent) / scale));
    }
    if flight.trajectory.len() < 2 {
        return Err(NotMeasured::skip("the flight has no path"));
    }
    let evidence = Evidence::Series { abscissa: "depth_m", ordinate: "residual_over_initial_energy", points };
    Ok(Measurement::new(residual).remark(format!("{} rows of the path", flight.trajectory.len())).evidence(evidence))
}

/// The larger; NaN if either is.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Index of the stage that holds `depth`.
fn stage_at(problem: &Problem, depth: f64) -> usize {
    problem.stages.iter().position(|s| depth < s.end).unwrap_or(problem.stages.len() - 1)
}

/// `∫ F dx` [J] over `way` from `depth`, entered at `speed`, through one stage.
///
/// W = V² along the way by the classical Runge-Kutta method in x, in substeps short enough that its fourth order
/// leaves about 1e-10 of the work of a long row, and round-off for short ones.
fn work(stage: &Stage, mass: f64, depth: f64, way: f64, speed: f64) -> f64 {
    const SUBSTEPS: usize = 64;
    let force = |x: f64, w: f64| stage.force(x, w.max(0.0).sqrt());
    let step = way / SUBSTEPS as f64;
    let (mut w, mut total, mut lost) = (speed * speed, 0.0, 0.0);
    for i in 0..SUBSTEPS {
        let x = depth + i as f64 * step;
        let f1 = force(x, w);
        let f2 = force(x + 0.5 * step, w - step * f1 / mass);
        let f3 = force(x + 0.5 * step, w - step * f2 / mass);
        let f4 = force(x + step, w - 2.0 * step * f3 / mass);
        let mean = (f1 + 2.0 * (f2 + f3) + f4) / 6.0;
        // Compensated, so that many short steps do not set the floor of the claim.
        let term = step * mean - lost;
        let sum = total + term;
        lost = (sum - total) - term;
        total = sum;
        w -= 2.0 * step * mean / mass;
    }
    total
}

/// Flies back from the end of a perforation to the face, which must be left with V0 after the same time.
pub(super) fn time_reversal(subject: &Subject<'_>) -> Result<Measurement, NotMeasured> {
    let problem = &subject.problem;
    let method = subject.method(None)?;
    let there = subject.fly(&method, Detail::Events)?;
    let back = way_back(problem, &there)
        .ok_or_else(|| NotMeasured::skip("from rest, or through viscosity, there is no way back"))?;
    let again = fly(&method, &back, Detail::End)?;
    let speed = (again.end.velocity / problem.impact_speed - 1.0).abs();
    let time = (again.end.time / there.end.time - 1.0).abs();
    Ok(Measurement::new(worse(speed, time))
        .remark(format!("back at the face with V0 (1 {:+.1e})", again.end.velocity / problem.impact_speed - 1.0)))
}

/// The problem in other units of length, mass and time must fly the same.
pub(super) fn similarity(subject: &Subject<'_>, units: Units) -> Result<Measurement, NotMeasured> {
    let Units { length, time, .. } = units;
    let method = subject.method(None)?;
    let plain = subject.fly(&method, Detail::Events)?;
    let scaled = fly(&method, &in_units(&subject.problem, units), Detail::Events)?;
    let back = Flight {
        end: crate::physics::State {
            time: scaled.end.time / time,
            depth: scaled.end.depth / length,
            velocity: scaled.end.velocity / length * time,
        },
        ..scaled
    };
    compare(subject, &plain, &back)
}

/// The same law cut into pieces, each a restart.
pub(super) fn split(subject: &Subject<'_>, pieces: usize) -> Result<Measurement, NotMeasured> {
    let problem = &subject.problem;
    let method = subject.method(None)?;
    let plain = subject.fly(&method, Detail::Events)?;
    let mut stages = Stages::new();
    for index in 0..problem.stages.len() {
        let law = problem.stages[index];
        let start = problem.start_of(index);
        // A stage without an end is cut where the flight went.
        let reach = if law.end.is_finite() { law.end } else { plain.end.depth.max(start) };
        for piece in 1..pieces {
            stages.push(Stage { end: start + (reach - start) * piece as f64 / pieces as f64, ..law });
        }
        stages.push(law);
    }
    let cut = Problem { stages, crater: None, target: Target::Stages, ..problem.clone() };
    let cut = fly(&method, &cut, Detail::Events)?;
    compare(subject, &plain, &cut)
}

/// Largest relative difference of what the scene leaves free at the end.
fn compare(subject: &Subject<'_>, plain: &Flight, other: &Flight) -> Result<Measurement, NotMeasured> {
    if !plain.outcome.agrees_with(other.outcome) {
        return Err(NotMeasured::broken(format!("{} became {}", plain.outcome, other.outcome)));
    }
    let mut worst = 0.0;
    for quantity in [Quantity::Depth, Quantity::Time, Quantity::Velocity] {
        if is_fixed(quantity, plain) {
            continue;
        }
        if let Some((a, b)) = value_of(quantity, plain).zip(value_of(quantity, other)) {
            let scale = if quantity == Quantity::Velocity { subject.problem.impact_speed } else { a };
            worst = worse(worst, ((a - b) / scale).abs());
        }
    }
    Ok(Measurement::new(worst))
}
