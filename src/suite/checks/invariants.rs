//! What holds whatever the answer is: energy, reversal in time, similarity, composition.

use super::super::claim::{Evidence, Found, Measurement, NotMeasured};
use super::{LAWS, Subject, Worst, off, solve, worse, worst_of};
use crate::integrators::{Detail, Flight};
use crate::physics::{Problem, Scene, Stage, Stages, State, Target};
use crate::studies::error::{free_quantities, signed_error, value_of};
use crate::studies::relations::{Units, in_units, reversed};

check! {
    /// Kinetic energy lost against work done, at every row of the trajectory; worst residual over M V0²/2.
    EnergyBalance {} in Energy, "relative", by energy_balance, compares (Method | Itself);
    /// Back from the end of a perforation to the face, which must be left at V0 after the same time; worst relative
    /// difference.
    TimeReversal {} in Energy, "relative", by time_reversal, compares nothing;
    /// The scene scaled in length, mass and time; relative change of depth, time and velocity in scaled units.
    Similarity {
        /// Factor of length.
        length: f64,
        /// Factor of mass.
        mass: f64,
        /// Factor of time.
        time: f64,
    } in Energy, "relative", by similarity, compares nothing;
    /// Every stage cut into pieces and restarted; relative change of depth, time and velocity.
    Split {
        /// Pieces of a stage.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        pieces: usize,
    } in Energy, "relative", by split, compares nothing;
    /// Random stages at whose ends masses join, by momentum and energy: worst error of depth, time and velocity at the end,
    /// and, where no drag acts, of the exit margin.
    JoinedMasses {
        /// How many problems.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        problems: usize,
    } in Energy, "relative", by joined_masses, compares (Method | Itself);
}

/// The work between two rows is `∫ F dx` along the path that starts from the earlier row's state, integrated here by
/// [`work`]: nothing of the method's own integration enters.
fn energy_balance(subject: &Subject<'_>) -> Found {
    let problem = subject.problem()?;
    applies!(problem.laws.is_empty(), "{LAWS}");
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
    applies!(problem.laws.is_empty(), "{LAWS}");
    let there = subject.solution(Detail::Events)?;
    let back = reversed(problem, &there)
        .ok_or_else(|| NotMeasured::skip("from rest, or through viscosity, there is no motion back"))?;
    let again = solve(&subject.method(None)?, &back, Detail::End)?;
    let speed = again.end.velocity / problem.impact_speed - 1.0;
    let time = off(again.end.time, there.end.time);
    Ok(Measurement::new(worse(speed.abs(), time)).remark(format!("back at the face with V0 (1 {speed:+.1e})")))
}

fn similarity(&Similarity { length, mass, time }: &Similarity, subject: &Subject<'_>) -> Found {
    let units = [length, mass, time];
    holds!(units.iter().all(|unit| *unit > 0.0 && unit.is_finite()), "a unit is a number above zero");
    holds!(units != [1.0; 3], "scaled by one, the scene is compared with itself");
    let problem = subject.problem()?;
    applies!(problem.laws.is_empty(), "{LAWS}");
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
    holds!(pieces > 1, "one piece is the whole stage, compared with itself");
    let problem = subject.problem()?;
    let plain = subject.solution(Detail::Events)?;
    applies!(problem.laws.is_empty(), "{LAWS}");
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

/// A stage of [`joined_masses`]: `p + q V²` over `length`, behind which `added` joins.
struct Part {
    p: f64,
    q: f64,
    length: f64,
    added: f64,
}

fn joined_masses(&JoinedMasses { problems }: &JoinedMasses, subject: &Subject<'_>) -> Found {
    let mut random = subject.random("joined masses");
    let method = subject.method(None)?;
    let mut worst = Worst::default();
    let mut index = 0;
    for _ in 0..10 * problems {
        if index == problems {
            break;
        }
        let mass = random.log_uniform(0.5, 5.0);
        let drag = if index.is_multiple_of(2) { 0.0 } else { random.log_uniform(0.3, 10.0) };
        let count = 2 + random.below(3);
        let parts: Vec<Part> = (0..count)
            .map(|stage| Part {
                p: random.log_uniform(1e4, 1e6),
                q: drag * random.uniform(0.5, 2.0),
                length: random.log_uniform(0.05, 0.5),
                added: if stage + 1 < count { random.log_uniform(0.05, 2.0) } else { 0.0 },
            })
            .collect();
        let work: f64 = parts.iter().map(|part| part.p * part.length).sum();
        let speed = (2.0 * work / mass * random.log_uniform(0.05, 20.0)).sqrt();
        let (end, margin, slowest) = end_by_hand(&parts, mass, speed);
        // Near a standstill in front of an end, its time is ill-conditioned.
        if margin.abs() < 0.01 || slowest < 0.1 * speed {
            continue;
        }
        let problem = with_joined_masses(&parts, mass, speed)?;
        let flight = solve(&method, &problem, Detail::End)?;
        let place = |what: &'static str| move || format!("{what} of problem {index}");
        let State { time, depth, velocity } = flight.end;
        worst.take(off(depth, end.depth), place("depth"));
        worst.take(off(time, end.time), place("time"));
        worst.take((velocity - end.velocity).abs() / speed, place("velocity"));
        if drag == 0.0 {
            let error = flight.exit_margin.unwrap_or(f64::NAN) - margin;
            worst.take(error.abs() / margin.abs().max(1.0), place("margin"));
        }
        index += 1;
    }
    Ok(worst.measurement())
}

/// The end of the flight through `parts`; its exit margin where no drag acts: V²/V0² at the far side, or the least of what a
/// stop lacks up to the end of any stage; and the least speed behind a stage.
fn end_by_hand(parts: &[Part], mass: f64, speed: f64) -> (State, f64, f64) {
    let (mut m, mut v, mut end) = (mass, speed, State { time: 0.0, depth: 0.0, velocity: speed });
    let (mut lacking, mut least, mut rests, mut slowest) = (0.0_f64, 0.0_f64, false, speed);
    for &Part { p, q, length, added } in parts {
        let share = m / (m + added);
        if rests {
            lacking -= 2.0 * p * length / m;
        } else {
            let decay = -(-2.0 * q * length / m).exp_m1();
            let w = if q == 0.0 { v * v - 2.0 * p * length / m } else { v * v * (1.0 - decay) - p / q * decay };
            rests = w <= 0.0;
            let (passed, after) = match (rests, q == 0.0) {
                (false, _) => (length, w.sqrt()),
                (true, true) => (m * v * v / (2.0 * p), 0.0),
                (true, false) => (m / (2.0 * q) * (q * v * v / p).ln_1p(), 0.0),
            };
            let root = (q / p).sqrt();
            end.time += if q == 0.0 {
                m * (v - after) / p
            } else {
                m / (p * q).sqrt() * ((v - after) * root / (1.0 + root * root * v * after)).atan2(1.0)
            };
            end.depth += passed;
            (v, end.velocity) = (after * share, after);
            slowest = if rests { slowest } else { slowest.min(v) };
            lacking = if rests { -2.0 * p * (length - passed) / m } else { 0.0 };
        }
        least = least.min(lacking);
        lacking *= share * share;
        m += added;
    }
    let margin = if rests { least } else { end.velocity * end.velocity };
    (end, margin / speed / speed, slowest)
}

/// The same as a scene, from its text.
fn with_joined_masses(parts: &[Part], mass: f64, speed: f64) -> Found<Problem> {
    let thickness: f64 = parts.iter().map(|part| part.length).sum();
    let mut text =
        format!("impact.velocity = {speed:e}\nprojectile.mass = {mass:e}\ntarget.thickness = {thickness:e}\n");
    let mut end = 0.0;
    for &Part { p, q, length, added } in parts {
        end += length;
        text += &format!("[[stage]]\nstatic_force = {p:e}\ndrag = {q:e}\n");
        if added > 0.0 {
            text += &format!("end = {end:e}\nadd_mass = {added:e}\n");
        }
    }
    let scene = Scene::from_toml(&text, "joined masses").map_err(|error| NotMeasured::broken(error.to_string()))?;
    scene.problem().map_err(|error| NotMeasured::broken(error.to_string()))
}
