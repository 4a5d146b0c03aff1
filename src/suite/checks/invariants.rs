//! What holds whatever the answer is: energy, reversal in time, similarity, composition.

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::{Subject, off, solve, worse, worst_of};
use crate::integrators::{Detail, Flight};
use crate::physics::{Problem, Stage, Stages, State, Target};
use crate::studies::error::{free_quantities, signed_error, value_of};
use crate::studies::relations::{Units, in_units, reversed};

check! {
    /// Kinetic energy lost against work done, at every row of the trajectory; worst residual over M V0²/2.
    EnergyBalance {} in Energy, "relative", by energy_balance;
    /// Back from the end of a perforation to the face, which must be left at V0 after the same time; worst relative
    /// difference.
    TimeReversal {} in Energy, "relative", by time_reversal;
    /// The scene scaled in length, mass and time; relative change of depth, time and velocity in scaled units.
    Similarity {
        /// Factor of length.
        length: f64,
        /// Factor of mass.
        mass: f64,
        /// Factor of time.
        time: f64,
    } in Energy, "relative", by similarity;
    /// Every stage cut into pieces and restarted; relative change of depth, time and velocity.
    Split {
        /// Pieces of a stage.
        pieces: usize,
    } in Energy, "relative", by split;
}

/// The work between two rows is `∫ F dx` along the path that starts from the earlier row's state, integrated here by
/// [`work`]: nothing of the method's own integration enters.
fn energy_balance(subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let is_viscous = problem.stages.iter().any(|s| s.viscosity != 0.0);
    applies!(!is_viscous, "the work of a viscous force is not smooth in x at rest");
    let flight = subject.solution(Detail::Trajectory)?;
    applies!(flight.trajectory.len() > 1, "the solution has no path");
    let scale = 0.5 * problem.mass * problem.impact_speed * problem.impact_speed;
    let mut residual = 0.0_f64;
    let mut spent = 0.0;
    let mut points = Vec::with_capacity(flight.trajectory.len());
    for rows in flight.trajectory.windows(2) {
        let (a, b) = (rows[0], rows[1]);
        let distance = b.state.depth - a.state.depth;
        if distance <= 0.0 {
            continue;
        }
        let middle = a.state.depth + 0.5 * distance;
        let law = problem.stages.iter().find(|stage| middle < stage.end).or(problem.stages.last());
        let law = law.ok_or_else(|| NotMeasured::broken("a problem without stages"))?;
        spent += work(law, problem.mass, a.state.depth, distance, a.state.velocity);
        let kinetic =
            0.5 * problem.mass * (problem.impact_speed - b.state.velocity) * (problem.impact_speed + b.state.velocity);
        residual = worse(residual, (kinetic - spent).abs() / scale);
        points.push((b.state.depth, (kinetic - spent) / scale));
    }
    let remark = format!("{} rows of the path", flight.trajectory.len());
    Ok(Measurement::new(residual).remark(remark).evidence(Evidence::Series(points)))
}

/// `∫ F dx` (J) over `distance` from `depth`, entered at `speed`, through one stage.
///
/// W = V² over x by the classical Runge-Kutta method, in substeps so short that its fourth order leaves about 1e-10 of
/// the work of a long row, and round-off for short ones.
fn work(stage: &Stage, mass: f64, depth: f64, distance: f64, speed: f64) -> f64 {
    const SUBSTEPS: usize = 64;
    let force = |x: f64, w: f64| stage.force(x, w.max(0.0).sqrt());
    let step = distance / SUBSTEPS as f64;
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

fn time_reversal(subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let there = subject.solution(Detail::Events)?;
    let back = reversed(problem, &there)
        .ok_or_else(|| NotMeasured::skip("from rest, or through viscosity, there is no motion back"))?;
    let again = solve(&subject.method(None)?, &back, Detail::End)?;
    let speed = again.end.velocity / problem.impact_speed - 1.0;
    let time = off(again.end.time, there.end.time);
    Ok(Measurement::new(worse(speed.abs(), time)).remark(format!("back at the face with V0 (1 {speed:+.1e})")))
}

fn similarity(&Similarity { length, mass, time }: &Similarity, subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    if !problem.laws.is_empty() {
        return Err(NotMeasured::skip("the parameters of an expression would have to be scaled, too"));
    }
    let plain = subject.solution(Detail::Events)?;
    let scaled = in_units(problem, Units { length, mass, time });
    let scaled = solve(&subject.method(None)?, &scaled, Detail::Events)?;
    let back = Flight {
        end: State {
            time: scaled.end.time / time,
            depth: scaled.end.depth / length,
            velocity: scaled.end.velocity / length * time,
        },
        ..scaled
    };
    compare(problem, &plain, &back)
}

fn split(&Split { pieces }: &Split, subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    let plain = subject.solution(Detail::Events)?;
    let mut stages = Stages::new();
    for index in 0..problem.stages.len() {
        let law = problem.stages[index];
        let start = problem.start_of(index);
        // A stage without an end is cut over the distance that was crossed.
        let reach = if law.end.is_finite() { law.end } else { plain.end.depth.max(start) };
        for piece in 1..pieces {
            stages.push(Stage { end: start + (reach - start) * piece as f64 / pieces as f64, ..law });
        }
        stages.push(law);
    }
    let cut = Problem { stages, crater: None, target: Target::Stages, ..problem.clone() };
    compare(problem, &plain, &solve(&subject.method(None)?, &cut, Detail::Events)?)
}

/// Largest relative difference of what the scene leaves free at the end.
fn compare(problem: &Problem, plain: &Flight, other: &Flight) -> Found {
    holds!(plain.outcome.agrees_with(other.outcome), "{} became {}", plain.outcome, other.outcome);
    let free = free_quantities(plain).filter(|quantity| !quantity.is_at_crater_end());
    let change = |quantity| {
        let (value, exact) = value_of(quantity, other).zip(value_of(quantity, plain))?;
        Some(signed_error(quantity, value, exact, problem.impact_speed).abs())
    };
    Ok(Measurement::new(worst_of(free.filter_map(change))))
}
