//! Between which numbers do the answers of a scene lie, as its numbers were written? Proved, or undecided.
//!
//! V_c is enclosed by two flights: at a speed below that the projectile stops, and at one above that it perforates. Stages
//! that end at depths let no two paths cross, and the continuous crater constant c leaves the speed at k d rising with the
//! impact speed, so that all speeds below stop and all above perforate (docs/enclosures.md, section 6).

use serde::Serialize;

use super::critical_velocity;
use super::error::Studied;
use super::quantity::Quantity;
use crate::integrators::{Detail, Enclosure, Flight, IntegrationError, Taylor};
use crate::physics::ball::Ball;
use crate::physics::decimals::Written;
use crate::physics::{EventKind, Outcome, Resolved, Scalar, Scene, State};
use crate::text::digits_between;

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

/// What is proved of each quantity of `scene`, in the order of [`Quantity::ALL`]; `None` where nothing is.
///
/// # Errors
/// As [`flight`].
pub fn quantities(scene: &Scene, written: &Written) -> Studied<[Option<(f64, f64)>; Quantity::ALL.len()]> {
    let flight = flight(scene, written, Detail::Events)??;
    let is_decided = flight.outcome != Outcome::Undecided;
    let crater = flight.events.iter().find(|event| event.kind == EventKind::CraterEnd).map(|event| event.state);
    let interval =
        |ball: Ball| Some((ball.lower().max(0.0), ball.upper())).filter(|(_, high)| is_decided && high.is_finite());
    Ok(Quantity::ALL.map(|quantity| match quantity {
        Quantity::Depth => interval(flight.end.depth),
        Quantity::Time => interval(flight.end.time),
        Quantity::Velocity => interval(flight.end.velocity),
        Quantity::CraterEndTime => interval(crater?.time),
        Quantity::CraterEndVelocity => interval(crater?.velocity),
        Quantity::CriticalVelocity => scene.thickness.and_then(|_| critical(scene, written)),
    }))
}

/// That `value`, rounded by `round_off` at most, is proved wrong and from which digit on, or right in every digit, where the exact one
/// is `proved` to lie between two numbers.
///
/// # Example
/// ```
/// use penetrode::studies::enclosure::sentence;
///
/// let proved = (0.144_826_789_065_4, 0.144_826_789_065_6);
/// assert_eq!(
///     sentence("the depth", 0.14483, 1e-10, proved, "m").unwrap(),
///     "the depth is wrong from digit 5 on: the exact value is proved to lie in 0.144826789065(40..61) m"
/// );
/// ```
pub fn sentence(name: &str, value: f64, round_off: f64, proved: (f64, f64), unit: &str) -> Option<String> {
    let (low, high) = proved;
    let interval = format!("the exact value is proved to lie in {} {unit}", digits_between(low, high));
    let miss = (low - value).max(value - high).max(0.0);
    // Of 0.14483 and 0.144826 the first digit counts 1e-1, and 4e-6 is first seen in the fifth.
    let digit = (value.abs().log10().floor() - miss.log10()).floor() + 1.0;
    if !value.is_finite() || low < 0.0 {
        None
    } else if (high - value).max(value - low) <= round_off {
        Some(format!("{name} is right in every digit: {interval}"))
    } else if miss <= round_off {
        Some(format!("{name} is not distinguished from the exact one: {interval}"))
    } else if value == 0.0 || digit < 2.0 {
        Some(format!("{name} is wrong: {interval}"))
    } else {
        Some(format!("{name} is wrong from digit {digit} on: {interval}"))
    }
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
/// `None` where no proof was found, or there is no V_c, or stages end at speeds or on conditions of the scene's own: then it is not proved that
/// one speed parts those that stop from those that perforate.
pub fn critical(scene: &Scene, written: &Written) -> Option<(f64, f64)> {
    let near = critical_velocity::of_scene(scene, &Taylor::default()).ok()?.velocity;
    between(scene, written, near)
}

/// As [`critical`], from a V_c `near` it.
pub fn between(scene: &Scene, written: &Written, near: f64) -> Option<(f64, f64)> {
    if !scene.ends.is_empty() {
        return None;
    }
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
