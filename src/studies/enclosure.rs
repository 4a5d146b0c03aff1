//! Between which numbers do the answers of a scene lie, as its numbers were written? Proved, or undecided.
//!
//! V_c is enclosed by two flights: at a speed below that the projectile stops, and at one above that it perforates. Stages
//! that end at depths let no two paths cross, and the continuous crater constant c leaves the speed at k d rising with the
//! impact speed, so that all speeds below stop and all above perforate (docs/enclosures.md, section 5).

use serde::Serialize;

use super::critical_velocity;
use super::error::Studied;
use crate::integrators::{Detail, Enclosure, Flight, IntegrationError, Taylor};
use crate::physics::ball::Ball;
use crate::physics::decimals::Written;
use crate::physics::{Outcome, Resolved, Scalar, Scene, State};

/// Flights that narrow the interval of V_c.
const FLIGHTS_MAX: u32 = 80;

/// How much wider than the speeds of which nothing is proved the interval of V_c may be.
const OPEN_SHARE: f64 = 0.03;

/// Impact speed (m/s) at which a target that is perforated at any speed is shown to be.
const SLOWEST: f64 = 1e-9;

/// Least and greatest number; `null` in JSON where there is none.
pub type Interval = (Option<f64>, Option<f64>);

/// What is known of a state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
pub struct Intervals {
    /// Depth (m).
    pub depth_m: Interval,
    /// Time (s).
    pub time_s: Interval,
    /// Velocity (m/s).
    pub velocity_m_s: Interval,
}

impl Intervals {
    /// Of a state, whose numbers are not negative.
    pub fn of(state: &State<Ball>) -> Self {
        let interval = |ball: Ball| {
            let (low, high) = ball.interval();
            (Some(low.max(0.0)), Some(high).filter(|high| *high < f64::INFINITY))
        };
        Self { depth_m: interval(state.depth), time_s: interval(state.time), velocity_m_s: interval(state.velocity) }
    }
}

/// What is proved of a row of a table: least and greatest number, SI; `None` where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[expect(missing_docs, reason = "the names say quantity, side and unit")]
pub struct Bounds {
    pub depth_lo_m: Option<f64>,
    pub depth_hi_m: Option<f64>,
    pub time_lo_s: Option<f64>,
    pub time_hi_s: Option<f64>,
    pub velocity_lo_m_s: Option<f64>,
    pub velocity_hi_m_s: Option<f64>,
    pub critical_velocity_lo_m_s: Option<f64>,
    pub critical_velocity_hi_m_s: Option<f64>,
}

/// Name of a column, and its cell.
pub type BoundsColumn = (&'static str, fn(&Bounds) -> Option<f64>);

/// The columns of [`Bounds`]; those of V_c are the last two.
pub const COLUMNS: [BoundsColumn; 8] = [
    ("depth_lo_m", |bounds| bounds.depth_lo_m),
    ("depth_hi_m", |bounds| bounds.depth_hi_m),
    ("time_lo_s", |bounds| bounds.time_lo_s),
    ("time_hi_s", |bounds| bounds.time_hi_s),
    ("velocity_lo_m_s", |bounds| bounds.velocity_lo_m_s),
    ("velocity_hi_m_s", |bounds| bounds.velocity_hi_m_s),
    ("critical_velocity_lo_m_s", |bounds| bounds.critical_velocity_lo_m_s),
    ("critical_velocity_hi_m_s", |bounds| bounds.critical_velocity_hi_m_s),
];

impl Bounds {
    /// The same with the end of a flight.
    #[must_use]
    pub fn with_end(self, end: &State<Ball>) -> Self {
        let Intervals { depth_m, time_s, velocity_m_s } = Intervals::of(end);
        Self {
            depth_lo_m: depth_m.0,
            depth_hi_m: depth_m.1,
            time_lo_s: time_s.0,
            time_hi_s: time_s.1,
            velocity_lo_m_s: velocity_m_s.0,
            velocity_hi_m_s: velocity_m_s.1,
            ..self
        }
    }

    /// The same with V_c.
    #[must_use]
    pub fn with_critical(self, proved: Option<(f64, f64)>) -> Self {
        let (low, high) = proved.unzip();
        Self { critical_velocity_lo_m_s: low, critical_velocity_hi_m_s: high, ..self }
    }
}

/// The flight of `scene` at its own speed, of the numbers that were `written`.
///
/// # Errors
/// As [`Scene::resolve`], and inside as [`Enclosure::enclose`].
pub fn flight(
    scene: &Scene,
    written: &Written,
    detail: Detail<'_>,
) -> Resolved<Result<Flight<Ball>, IntegrationError>> {
    Ok(Enclosure.enclose(&scene.enclosed(written, None)?, detail))
}

/// What is proved of `scene`, of the numbers that were `written`: of its flight, if it has a speed, and of V_c, if it has a far
/// side.
///
/// # Errors
/// As [`flight`].
pub fn bounds(scene: &Scene, written: &Written) -> Studied<Bounds> {
    let mut bounds = Bounds::default();
    if scene.velocity.is_some() {
        bounds = bounds.with_end(&flight(scene, written, Detail::End)??.end);
    }
    if scene.thickness.is_some() {
        bounds = bounds.with_critical(critical(scene, written));
    }
    Ok(bounds)
}

/// Refuses a scene of which no flight can be enclosed.
///
/// # Errors
/// As [`Enclosure::enclose`].
pub fn refusal(scene: &Scene, written: &Written) -> Result<(), IntegrationError> {
    let speed = Some(Ball::from_f64(scene.velocity.filter(|speed| *speed > 0.0).unwrap_or(1.0)));
    match scene.enclosed(written, speed).map(|problem| Enclosure.enclose(&problem, Detail::End)) {
        Ok(Err(error @ IntegrationError::Refused { .. })) => Err(error),
        _ => Ok(()),
    }
}

/// V_c of `scene` (m/s), of the numbers that were `written`: between two numbers, which for most scenes are neighbours.
///
/// `None` where no proof was found, or there is no V_c.
pub fn critical(scene: &Scene, written: &Written) -> Option<(f64, f64)> {
    let near = critical_velocity::of_scene(scene, &Taylor::default()).ok()?.velocity;
    between(scene, written, near)
}

/// As [`critical`], from a V_c `near` it.
pub fn between(scene: &Scene, written: &Written, near: f64) -> Option<(f64, f64)> {
    let flights = std::cell::Cell::new(0);
    let perforates = |speed: f64| {
        flights.set(flights.get() + 1);
        let problem = scene.enclosed(written, Some(Ball::from_f64(speed))).ok()?;
        match Enclosure.enclose(&problem, Detail::End) {
            Ok(flight) if flight.outcome == Outcome::Undecided => None,
            Ok(flight) => Some(flight.outcome == Outcome::Perforated),
            Err(IntegrationError::NeverEnds { .. }) => Some(false),
            Err(_) => None,
        }
    };
    if near == 0.0 {
        return (perforates(SLOWEST) == Some(true)).then_some((0.0, SLOWEST));
    }
    // Away from the guess until both outcomes are proved; then in halves, as far as they are.
    let away = |wanted: bool| {
        let mut step = near * f64::EPSILON;
        let mut speed = near;
        while flights.get() < FLIGHTS_MAX && speed > 0.0 && speed < f64::INFINITY {
            if perforates(speed) == Some(wanted) {
                return Some(speed);
            }
            speed = if wanted { near + step } else { near - step };
            step *= 4.0;
        }
        None
    };
    let (mut low, mut high) = (away(false)?, away(true)?);
    // Speeds between which no outcome is proved.
    let mut open: Option<(f64, f64)> = None;
    while flights.get() < FLIGHTS_MAX {
        let (from, to) = match open {
            None => (low, high),
            Some((from, to)) if from - low > high - to => (low, from),
            Some((_, to)) => (to, high),
        };
        let middle = from + 0.5 * (to - from);
        let is_narrow = open.is_some_and(|(least, greatest)| to - from <= OPEN_SHARE * (greatest - least));
        if middle <= from || middle >= to || is_narrow {
            break;
        }
        match perforates(middle) {
            Some(true) => high = middle,
            Some(false) => low = middle,
            None => open = Some(open.map_or((middle, middle), |(from, to)| (from.min(middle), to.max(middle)))),
        }
    }
    Some((low, high))
}
