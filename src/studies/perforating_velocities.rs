//! The impact speeds that perforate, where they need not be all above one critical velocity.
//!
//! Where stages end at depths, the faster of two projectiles leaves if the slower one does (`docs/theory.md`, section 10). The same
//! holds where they end at speeds and no force drives. An end on a condition g(x, V) = 0, and a mass that joins, let paths in
//! the plane (x, W) cross: a faster projectile may meet its condition elsewhere, or not at all. The speeds that
//! perforate are then intervals.
//!
//! Flights at a thousand speeds, in equal ratios, show where the outcome changes; between two stops or two
//! perforations whose exit margins come near to zero the extremum is sought. Each change is then halved to round-off. An
//! interval narrower than a step of the scan is found only so.
//!
//! A plug asks for no scan. The forces in front of it grow with V, or do not depend on it, and what is left of the slab withstands a
//! force of x alone. Of two projectiles the faster one is the faster at each depth, also in a crater whose constant follows from
//! V0 (`dV²/dV0² = 1 - Q x²/(k d (M + k d Q)) > 0` up to k d), so that it breaks the plug no later. All speeds above one
//! perforate, and halving alone finds that one.

use super::critical_velocity::{CriticalError, Sought};
use crate::integrators::{Cost, Detail, IntegrationError, Integrator};
use crate::physics::{Outcome, Problem, Resolved};

/// Speeds at which the scan asks for the outcome.
const PLACES: u32 = 1000;

/// Range of the scan about the speed that the static work takes, and the speeds that the scene names.
const SLOWEST: f64 = 1e-2;
const FASTEST: f64 = 30.0;

/// Halvings of a change of the outcome: more than a speed has digits.
const HALVINGS: u32 = 80;

/// Flights in which an extremum of the margin is sought, and growth of what is lost in the error bounds.
const SECTIONS: u32 = 24;
const WIDENING: f64 = 8.0;

/// An end of an interval of speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The speed (m/s).
    pub velocity: f64,
    /// Half-width of the range (m/s) in which the outcome is not decided.
    pub error_bar: f64,
}

/// Speeds that perforate, from one to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The least; 0 where the slowest that was tried perforates.
    pub low: Edge,
    /// The greatest; `None` where the fastest that was tried perforates.
    pub high: Option<Edge>,
}

/// What a scan found.
#[derive(Clone, Debug, PartialEq)]
pub struct Perforating {
    /// The intervals, ascending.
    pub intervals: Vec<Interval>,
    /// Slowest and fastest speed tried (m/s).
    pub tried: (f64, f64),
    /// Flights it took.
    pub evaluations: u32,
    /// Work of all flights.
    pub cost: Cost,
}

/// The impact speeds that perforate, where those are all above one: as [`perforating`], by halving alone.
///
/// # Errors
/// [`CriticalError`]: a scene or a flight failed.
pub fn from_one_on(
    resolve: impl Fn(f64) -> Resolved,
    integrator: &dyn Integrator,
    scale: (f64, f64),
) -> Sought<Perforating> {
    let (slowest, fastest) = (SLOWEST * scale.0, FASTEST * scale.1);
    let mut scan = Scan { resolve, integrator, evaluations: 0, cost: Cost::default() };
    let (low, high) = (scan.at(slowest)?, scan.at(fastest)?);
    let low = match (low.perforates(), high.perforates()) {
        (true, _) => Some(Edge { velocity: 0.0, error_bar: slowest }),
        (false, true) => Some(scan.change(low, high)?),
        (false, false) => None,
    };
    let intervals = low.into_iter().map(|low| Interval { low, high: None }).collect();
    Ok(Perforating { intervals, tried: (slowest, fastest), evaluations: scan.evaluations, cost: scan.cost })
}

/// Whether paths through `problem` may cross, so that several intervals of impact speeds may perforate.
pub fn may_cross(problem: &Problem) -> bool {
    let laws = || (0..problem.stages.len()).filter_map(|index| problem.laws.of(index));
    if laws().any(|law| law.end().is_some_and(|end| !end.is_speed()) || law.joining(0.0).is_some()) {
        return true;
    }
    let ends_at_speed = laws().any(|law| law.end().is_some());
    let deepest = if problem.has_exit() { problem.exit_depth } else { f64::INFINITY };
    ends_at_speed && !laws().all(|law| law.never_drives(deepest))
}

/// The outcome of a flight.
#[derive(Clone, Copy, Debug)]
struct Tried {
    velocity: f64,
    /// Its exit margin times V0²; only the sign where the flight never ends.
    margin: f64,
    is_decided: bool,
}

impl Tried {
    fn perforates(&self) -> bool {
        self.margin >= 0.0
    }
}

struct Scan<'a, F> {
    resolve: F,
    integrator: &'a dyn Integrator,
    evaluations: u32,
    cost: Cost,
}

impl<F: Fn(f64) -> Resolved> Scan<'_, F> {
    fn at(&mut self, velocity: f64) -> Sought<Tried> {
        let problem = (self.resolve)(velocity).map_err(|cause| CriticalError::Scene { velocity, cause })?;
        self.evaluations += 1;
        match self.integrator.solve(&problem, Detail::End) {
            Ok(flight) => {
                self.cost = self.cost + flight.cost;
                let size = flight.exit_margin.unwrap_or(f64::NAN).abs() * velocity * velocity;
                let perforates = match flight.outcome {
                    Outcome::Perforated => true,
                    Outcome::Undecided => flight.exit_margin.unwrap_or(-1.0) >= 0.0,
                    _ => false,
                };
                let margin = if perforates { size } else { -size.max(f64::MIN_POSITIVE) };
                Ok(Tried { velocity, margin, is_decided: flight.outcome != Outcome::Undecided })
            }
            // It stays in the target.
            Err(IntegrationError::NeverEnds { .. }) => {
                Ok(Tried { velocity, margin: f64::NEG_INFINITY, is_decided: true })
            }
            Err(cause) => Err(CriticalError::Flight { velocity, cause }),
        }
    }

    /// A speed between two of one outcome at which it is the other, if the least margin between them is of it.
    fn hidden(&mut self, mut low: f64, mut high: f64, perforates: bool) -> Sought<Option<Tried>> {
        for _ in 0..SECTIONS {
            let [one, other] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            let (left, right) = (self.at(one)?, self.at(other)?);
            if let Some(found) = [left, right].into_iter().find(|tried| tried.perforates() != perforates) {
                return Ok(Some(found));
            }
            if left.margin.abs() <= right.margin.abs() { high = other } else { low = one }
        }
        Ok(None)
    }

    /// Where the outcome changes between two speeds.
    fn change(&mut self, mut low: Tried, mut high: Tried) -> Sought<Edge> {
        let is_first = low.perforates();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low.velocity + high.velocity);
            if middle <= low.velocity || middle >= high.velocity {
                break;
            }
            let tried = self.at(middle)?;
            if tried.perforates() == is_first { low = tried } else { high = tried }
        }
        let velocity = if is_first { low.velocity } else { high.velocity };
        // Out to where both outcomes are decided.
        let mut error_bar = 2.0 * f64::EPSILON * velocity;
        for _ in 0..HALVINGS {
            let sides = [self.at(velocity - error_bar)?, self.at(velocity + error_bar)?];
            if sides[0].is_decided && sides[1].is_decided && sides[0].perforates() != sides[1].perforates() {
                break;
            }
            error_bar *= WIDENING;
            if error_bar > 0.5 * velocity {
                return Ok(Edge { velocity, error_bar: 0.5 * velocity });
            }
        }
        Ok(Edge { velocity, error_bar })
    }
}

/// The impact speeds that perforate the target that `resolve` makes of an impact speed, by a scan about `scale` (m/s).
///
/// # Errors
/// [`CriticalError`]: a scene or a flight failed.
pub fn perforating(
    resolve: impl Fn(f64) -> Resolved,
    integrator: &dyn Integrator,
    scale: (f64, f64),
) -> Sought<Perforating> {
    let (slowest, fastest) = (SLOWEST * scale.0, FASTEST * scale.1);
    let mut scan = Scan { resolve, integrator, evaluations: 0, cost: Cost::default() };
    let place = |index: u32| slowest * (fastest / slowest).powf(f64::from(index) / f64::from(PLACES));
    let mut tried = Vec::with_capacity(PLACES as usize + 1);
    for index in 0..=PLACES {
        tried.push(scan.at(place(index))?);
    }
    let mut all = vec![tried[0]];
    for three in tried.windows(3) {
        let [before, here, after] = three else { continue };
        let is_one = [before, after].iter().all(|other| other.perforates() == here.perforates());
        // A margin relative to V0², so that one that rises with the speed has no extremum.
        let size = |tried: &Tried| tried.margin.abs() / tried.velocity / tried.velocity;
        if is_one && size(here) < size(before) && size(here) <= size(after) {
            all.extend(scan.hidden(before.velocity, after.velocity, here.perforates())?);
        }
        all.push(*here);
    }
    all.extend(tried.last());
    all.sort_by(|a, b| a.velocity.total_cmp(&b.velocity));
    let mut intervals: Vec<Interval> = Vec::new();
    if all[0].perforates() {
        intervals.push(Interval { low: Edge { velocity: 0.0, error_bar: slowest }, high: None });
    }
    for pair in all.windows(2) {
        let [low, high] = pair else { continue };
        if low.perforates() == high.perforates() {
            continue;
        }
        let edge = scan.change(*low, *high)?;
        if high.perforates() {
            intervals.push(Interval { low: edge, high: None });
        } else if let Some(last) = intervals.last_mut() {
            last.high = Some(edge);
        }
    }
    Ok(Perforating { intervals, tried: (slowest, fastest), evaluations: scan.evaluations, cost: scan.cost })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a scene that does not resolve is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::Taylor;
    use crate::physics::{Concrete, CraterStiffness, Plug, Resistance, Scene};
    use crate::studies::random::Random;
    use crate::testing::shipped;

    /// The scan asks a thousand speeds, and knows nothing of an order. Random slabs: thin and thick, weak and strong, with plenty of drag and
    /// none, a given c and one that follows from V0; of some the plug breaks while the projectile moves, so that V_r jumps.
    #[test]
    fn a_plug_perforates_from_the_speed_on_that_the_scan_finds() {
        let mut random = Random::for_part(1, "plugs");
        let mut seen = 0;
        for index in 0..24 {
            let mut scene = Scene { velocity: None, ..shipped("plug") };
            let Resistance::Concrete(Concrete { diameter, density, crater_stiffness, .. }) = &mut scene.resistance
            else {
                unreachable!("a slab of one concrete")
            };
            *density = [0.0, 2400.0, 20_000.0][index % 3];
            if index % 4 == 3 {
                *crater_stiffness = CraterStiffness::Given(random.log_uniform(1e6, 3e7));
            }
            scene.thickness = Some(*diameter * random.log_uniform(0.5, 12.0));
            let (half_angle, shear_strength) = (80.0 * random.unit(), random.log_uniform(1e6, 40e6));
            scene.plug = Some(Plug { half_angle, shear_strength });
            let resolve = |speed| scene.resolve(speed);
            let scale = (100.0, 100.0);
            let scanned = perforating(resolve, &Taylor::default(), scale).unwrap();
            let halved = from_one_on(resolve, &Taylor::default(), scale).unwrap();
            assert!(halved.evaluations < 120, "{}", halved.evaluations);
            assert_eq!(scanned.intervals.len(), halved.intervals.len(), "{index}: {scanned:?} {halved:?}");
            for (one, other) in scanned.intervals.iter().zip(&halved.intervals) {
                assert_eq!((one.high, other.high), (None, None), "{index}");
                let apart = (one.low.velocity - other.low.velocity).abs();
                assert!(apart <= one.low.error_bar + other.low.error_bar, "{index}: {one:?} {other:?}");
                seen += 1;
            }
        }
        assert!(seen > 20, "{seen}");
    }
}
