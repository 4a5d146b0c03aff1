//! The figure of one flight: depth and velocity over time, velocity and force over depth.

use super::chart::{Axis, Panel, Point, Style};
use super::figure::Figure;
use super::text::engineering;
use crate::integrators::{Flight, Sample};

/// The figure of `flight`, whose trajectory holds the states to be drawn; `None` where it holds none.
pub fn of_flight(flight: &Flight) -> Option<Figure> {
    let points = |point: fn(&Sample) -> Point| -> Vec<Point> {
        let points = flight.trajectory.iter().map(point);
        points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
    };
    let events = |of: fn(f64, f64, f64) -> Point| -> Vec<Point> {
        flight.events.iter().map(|event| of(event.state.time, event.state.depth, event.state.velocity)).collect()
    };
    let [time, depth] = [("t", "ms"), ("x", "mm")].map(|(name, unit)| Axis::linear(name, unit).including([0.0]));
    let velocity = Axis::linear("V", "m/s").including([0.0]);
    let event = Style::marks(1);
    let panels = vec![
        Panel::new("depth over time", time.clone(), depth.clone())
            .series("flight", Style::line(0), points(|s| (1e3 * s.state.time, 1e3 * s.state.depth)))
            .series("events", event, events(|t, x, _| (1e3 * t, 1e3 * x))),
        Panel::new("velocity over time", time, velocity)
            .series("flight", Style::line(0), points(|s| (1e3 * s.state.time, s.state.velocity)))
            .series("events", event, events(|t, _, v| (1e3 * t, v))),
        Panel::new("force over depth", depth, Axis::linear("F", "kN").including([0.0])).series(
            "flight",
            Style::line(0),
            points(|s| (1e3 * s.state.depth, 1e-3 * s.force)),
        ),
    ];
    let end = flight.end;
    let [x, t, v] =
        [(end.depth, "m"), (end.time, "s"), (end.velocity, "m/s")].map(|(value, unit)| engineering(value, unit));
    Figure::new("flight", "", &[], &[&flight.outcome, &x, &t, &v], panels)
}
