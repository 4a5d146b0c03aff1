//! The objects of the peer protocol, and how far two answers to one question differ.

use serde::{Deserialize, Deserializer, Serialize};

use crate::integrators::{Cost, Flight};
use crate::physics::{CraterStiffness, Event, EventKind, Outcome, Problem, Scene, Stage, State, Target};

/// A flight that a peer is asked for. The client numbers the questions, so there is no `id` here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeerRequest {
    /// Mass M (kg).
    pub mass_kg: f64,
    /// Impact speed V0 (m/s).
    pub velocity_m_s: f64,
    /// Exit depth (m); `null` for a semi-infinite target.
    pub exit_depth_m: Option<f64>,
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerances of depth (m) and velocity (m/s).
    pub atol: [f64; 2],
    /// Flights to take the median time of; 1 unless time is measured.
    pub repeats: u32,
    /// The stages, in order.
    pub stages: Vec<Stage>,
    /// Step (s) that a peer of fixed steps must use; not sent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dt_s: Option<f64>,
    /// The physical scene that the problem stems from; `null` for any other.
    #[serde(default)]
    pub scene: Option<PeerScene>,
}

/// The numbers of a physical scene: one crater, one medium behind it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeerScene {
    /// Mass M (kg).
    pub mass_kg: f64,
    /// Diameter d (m).
    pub diameter_m: f64,
    /// Nose factor N*.
    pub nose_factor: f64,
    /// Compressive strength fc (Pa).
    pub strength_pa: f64,
    /// Density rho (kg/m³).
    pub density_kg_m3: f64,
    /// Thickness H (m); `null` for a semi-infinite target.
    pub thickness_m: Option<f64>,
    /// Static strength over fc; `null` means Eq. 14.
    #[serde(rename = "S")]
    pub static_factor: Option<f64>,
    /// Inertia factor.
    #[serde(rename = "B")]
    pub inertia_factor: f64,
    /// Crater depth in diameters.
    #[serde(rename = "k")]
    pub crater_ratio: f64,
    /// Crater constant c (N/m); `null` for the one that makes the force continuous.
    pub crater_stiffness_n_m: Option<f64>,
    /// Impact velocity V0 (m/s).
    pub velocity_m_s: f64,
    /// When the target counts as perforated: `full-depth` or `ndrc`.
    pub criterion: String,
}

impl PeerScene {
    /// The numbers of `scene`; `None` for stages, layers and a scene without an impact velocity.
    pub fn of(scene: &Scene) -> Option<Self> {
        let concrete = scene.concrete().filter(|concrete| concrete.layers.is_empty())?;
        Some(Self {
            mass_kg: scene.mass,
            diameter_m: concrete.diameter,
            nose_factor: concrete.nose_factor,
            strength_pa: concrete.strength,
            density_kg_m3: concrete.density,
            thickness_m: scene.thickness,
            static_factor: (!concrete.follows_eq14).then_some(concrete.static_factor),
            inertia_factor: concrete.inertia_factor,
            crater_ratio: concrete.crater_ratio,
            crater_stiffness_n_m: match concrete.crater_stiffness {
                CraterStiffness::Given(stiffness) => Some(stiffness),
                CraterStiffness::Continuous => None,
            },
            velocity_m_s: scene.velocity?,
            criterion: <&str>::from(scene.criterion).to_owned(),
        })
    }
}

/// Why a peer is not asked for a problem with a law of its own.
#[cfg(feature = "report")]
pub(crate) const NO_LAWS: &str = "a peer is given the coefficients of stages, and a stage has a law of its own";

impl PeerRequest {
    /// Asks for `problem` at relative tolerance `rtol`; absolute tolerances are `rtol` times (first boundary in x, the
    /// exit depth included; V0). Without a boundary the depth scale is the distance to rest under the force at impact.
    pub fn from_problem(problem: &Problem, rtol: f64) -> Self {
        Self {
            mass_kg: problem.mass,
            velocity_m_s: problem.impact_speed,
            exit_depth_m: problem.has_exit().then_some(problem.exit_depth),
            rtol,
            atol: [rtol * depth_scale(problem), rtol * problem.impact_speed],
            repeats: 1,
            stages: problem.stages.to_vec(),
            dt_s: None,
            scene: None,
        }
    }

    /// The outcome of an answer that names none and ends at `depth` (m): it perforates where it reaches the exit depth within
    /// the tolerance asked for.
    pub fn outcome_at(&self, depth: f64) -> Outcome {
        let is_reached = |exit: f64| exit - depth <= (self.rtol * exit).max(self.atol[0]);
        if self.exit_depth_m.is_some_and(is_reached) { Outcome::Perforated } else { Outcome::Stopped }
    }

    /// The problem that this asks for; `crater` is the stage that ends at k d, if there is one.
    ///
    /// Takes the numbers as they are: meant for requests of ours, not for input from outside.
    pub fn problem(&self, crater: Option<usize>) -> Problem {
        let problem = Problem::of_stages(self.mass_kg, self.velocity_m_s, self.stages.iter().copied())
            .with_exit(self.exit_depth_m.unwrap_or(f64::INFINITY));
        Problem { crater, target: if crater.is_some() { Target::CraterAndTunnel } else { Target::Stages }, ..problem }
    }
}

/// Depth (m) that scales the absolute tolerance.
fn depth_scale(problem: &Problem) -> f64 {
    let boundaries = problem.stages.iter().map(|stage| stage.end).chain([problem.exit_depth]);
    let first = boundaries.filter(|depth| *depth > 0.0).fold(f64::INFINITY, f64::min);
    if first.is_finite() {
        return first;
    }
    let speed = problem.impact_speed;
    let to_rest = 0.5 * problem.mass * speed * speed / problem.stages[0].force(0.0, speed).abs();
    // A crater without an end and no boundary at all: nothing gives a length, so the unit does.
    if to_rest.is_finite() && to_rest > 0.0 { to_rest } else { 1.0 }
}

/// What a peer answered: an outcome and finite numbers.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PeerAnswer {
    /// How the flight ended; a peer may say `stopped` for any stop, or nothing: then the depth decides.
    #[serde(default = "not_named", deserialize_with = "by_name")]
    pub outcome: Outcome,
    /// Depth at the end (m).
    pub depth_m: f64,
    /// Time of the end (s).
    pub time_s: f64,
    /// Velocity at the end (m/s).
    pub velocity_m_s: f64,
    /// Events in time order, as far as the peer lists them.
    #[serde(default, deserialize_with = "none_if_null")]
    pub events: Vec<Event>,
    /// Evaluations of the force, where the peer counts them.
    pub force_evaluations: Option<u64>,
    /// Time of one flight (ns), the median of the repeats.
    pub wall_ns: Option<f64>,
    /// Quartiles of that time (ns), where the peer gives its spread.
    pub wall_ns_quartiles: Option<[f64; 2]>,
}

/// How far one quantity of two answers differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// `depth`, `time`, `velocity`, or an event and what of it: `crater-end time`, `stage-end 2 velocity`.
    pub quantity: String,
    /// With its sign; depth and times relative to the reference, velocities to V0.
    pub signed: f64,
    /// Its absolute value.
    pub relative: f64,
    /// How much the problem itself magnifies a relative error of the velocity or the energy in this quantity, at least
    /// 1: V0/V at a place passed with velocity V; V0/(a T) in the time T of a rest that is reached with deceleration a.
    /// Divide by it before comparing with what a program can do.
    pub conditioning: f64,
}

impl PeerAnswer {
    /// The answer as a flight through `problem`, with the events that the peer lists.
    pub fn flight(&self, problem: &Problem) -> Flight {
        // A peer does not know which stage is the crater: its `stage-end` there is the same event as `crater-end`, and its
        // `crater-end` may be that of the first stage, whatever that is.
        let crater = |depth: f64| {
            let distance = |stage: &usize| (problem.stages[*stage].end - depth).abs();
            problem.crater.into_iter().chain([0]).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
        };
        let event = |event: &Event| {
            let kind = match event.kind {
                EventKind::StageEnd(index) => EventKind::boundary(problem, index),
                EventKind::CraterEnd => EventKind::boundary(problem, crater(event.state.depth)),
                kind => kind,
            };
            Event { kind, ..*event }
        };
        Flight {
            outcome: self.outcome,
            stage: 0,
            end: State { time: self.time_s, depth: self.depth_m, velocity: self.velocity_m_s },
            events: self.events.iter().map(event).collect(),
            exit_margin: None,
            exit_margin_error: None,
            cost: Cost { force_evaluations: self.force_evaluations.unwrap_or(0), ..Cost::default() },
            trajectory: Vec::new(),
            step_limit: None,
            notes: Vec::new(),
        }
    }

    /// Whether the events are those of the stages, each once, in the order of time.
    pub fn has_events_in_order(&self, request: &PeerRequest) -> bool {
        // Two events of one place may differ in time by what the tolerance allows.
        self.events.iter().enumerate().all(|(index, Event { kind, state })| {
            let is_known = !matches!(kind, EventKind::StageEnd(stage) if *stage >= request.stages.len());
            let latest = state.time + request.rtol * self.time_s.abs();
            let follows = |before: &Event| before.kind != *kind && before.state.time <= latest;
            is_known && self.events[..index].iter().all(follows)
        })
    }

    /// The first event of `reference` before its end that a peer leaves out which lists others; the event of the end is in
    /// the numbers of the end, and a peer may list none at all.
    pub fn left_out<'a>(&self, reference: &'a Flight, problem: &Problem) -> Option<&'a Event> {
        let listed = self.flight(problem);
        let before = reference.events.iter().filter(|event| event.state.depth < reference.end.depth);
        before.into_iter().find(|event| !self.events.is_empty() && listed.at(event.kind).is_none())
    }

    /// Differences from `reference`, another solution of `problem`: of the end, and of each event listed here. An event
    /// that the reference lacks is compared with its end.
    ///
    /// `None` if the outcomes contradict each other: then no number can be compared.
    pub fn differences_from(&self, reference: &Flight, problem: &Problem) -> Option<Vec<Difference>> {
        if !self.outcome.agrees_with(reference.outcome) {
            return None;
        }
        let ours = self.flight(problem);
        let mut differences = compare("", ours.end, reference.end, problem);
        for Event { kind, state } in &ours.events {
            let prefix = match kind {
                EventKind::StageEnd(index) => format!("stage-end {index} "),
                _ => format!("{} ", kind.name()),
            };
            // An event that the reference lacks is none, unless it is where the reference ends.
            let theirs = reference.at(*kind).unwrap_or(reference.end);
            // Of what happens at impact nothing is relative: a little over the flight is little.
            let ours = if theirs.time == 0.0 && theirs.depth == 0.0 && is_little(*state, reference.end) {
                State { velocity: state.velocity, ..theirs }
            } else {
                *state
            };
            differences.extend(compare(&prefix, ours, theirs, problem));
        }
        Some(differences)
    }
}

/// Whether a state lies within roundings of a flight behind its impact.
fn is_little(state: State, end: State) -> bool {
    state.depth.abs() <= f64::EPSILON * end.depth && state.time.abs() <= f64::EPSILON * end.time
}

/// Depth, time and velocity of two states, each with its conditioning.
fn compare(prefix: &str, ours: State, theirs: State, problem: &Problem) -> Vec<Difference> {
    let names = ["depth", "time", "velocity"];
    names
        .into_iter()
        .zip(errors(ours, theirs, problem.impact_speed))
        .zip(conditioning(theirs, problem))
        .map(|((name, signed), conditioning)| Difference {
            quantity: format!("{prefix}{name}"),
            signed,
            relative: signed.abs(),
            conditioning,
        })
        .collect()
}

/// Errors with their signs of depth, time and velocity: relative, of the velocity over `impact_speed` (m/s).
pub fn errors(ours: State, theirs: State, impact_speed: f64) -> [f64; 3] {
    // Equal zeros differ by nothing, whatever the scale.
    let over = |ours: f64, theirs: f64, scale: f64| if ours == theirs { 0.0 } else { (ours - theirs) / scale };
    [
        over(ours.depth, theirs.depth, theirs.depth.abs()),
        over(ours.time, theirs.time, theirs.time.abs()),
        over(ours.velocity, theirs.velocity, impact_speed),
    ]
}

/// [`Difference::conditioning`] of depth, time and velocity in the state `at`.
pub fn conditioning(at: State, problem: &Problem) -> [f64; 3] {
    // W = V² has the relative error of the energy: dV = dW/2V, and the time at a place follows dx/V.
    let passing = if at.velocity > 0.0 { (problem.impact_speed / at.velocity).max(1.0) } else { 1.0 };
    let is_passing = at.velocity > 0.0;
    let timing = if is_passing { passing } else { (problem.impact_speed / change_to_rest(at, problem)).max(1.0) };
    [1.0, timing, passing]
}

/// Velocity (m/s) that the deceleration at rest would take away in the whole time of the flight; infinite without one.
fn change_to_rest(rest: State, problem: &Problem) -> f64 {
    let index = problem.stages.iter().position(|stage| rest.depth <= stage.end).unwrap_or(problem.stages.len() - 1);
    let change = problem.stages[index].force(rest.depth, 0.0).abs() / problem.mass * rest.time;
    if change > 0.0 { change } else { f64::INFINITY }
}

/// Where a peer names no outcome; replaced by the outcome that the depth means.
fn not_named() -> Outcome {
    Outcome::Undecided
}

fn by_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Outcome, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or_else(not_named))
}

fn none_if_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Event>, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or_default())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use smallvec::smallvec;

    use super::*;

    fn problem() -> Problem {
        Problem::crater_and_tunnel(2.0, 300.0, Some(Stage::crater(1e7, 0.1)), Stage::tunnel(8e5, 3.25))
    }

    fn answer(outcome: Outcome, velocity: f64, events: &str) -> PeerAnswer {
        let (depth, time) = ("\"depth_m\": 0.2", "\"time_s\": 1e-3");
        let text =
            format!(r#"{{"outcome": "{outcome}", {depth}, {time}, "velocity_m_s": {velocity}, "events": {events}}}"#);
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn an_event_at_impact_may_lie_within_roundings_of_the_flight_behind_it() {
        use crate::integrators::{Detail, Integrator, Taylor};
        let stages = [Stage::tunnel(1e4, 0.0).until(0.0), Stage::tunnel(8e5, 3.25)];
        let problem = Problem::of_stages(2.0, 300.0, stages);
        let flight = Taylor::default().solve(&problem, Detail::Events).unwrap();
        let largest = |time: &str| {
            let listed = format!(
                r#"[{{"event": "stage-end", "stage": 0, "depth_m": 0.0, "time_s": {time}, "velocity_m_s": 300.0}}]"#
            );
            let end = answer(Outcome::Stopped, 0.0, &listed);
            let answer = PeerAnswer { depth_m: flight.end.depth, time_s: flight.end.time, ..end };
            let all = answer.differences_from(&flight, &problem).unwrap();
            all.iter().fold(0.0, |largest, difference| f64::max(largest, difference.relative))
        };
        assert_eq!(largest("3e-43"), 0.0);
        assert_eq!(largest("1e-9"), f64::INFINITY);
    }

    #[test]
    fn a_request_says_the_problem_and_reads_back_to_it() {
        let request = PeerRequest::from_problem(&problem(), 1e-12);
        let text = serde_json::to_string(&request).unwrap();
        assert!(text.contains(r#""exit_depth_m":null"#) && text.contains(r#""end_m":null"#), "{text}");
        assert_eq!(serde_json::from_str::<PeerRequest>(&text).unwrap().problem(Some(0)), problem());
    }

    #[test]
    fn absolute_tolerances_scale_with_the_first_boundary_and_the_impact_speed() {
        let depth_tolerance = |problem: &Problem| PeerRequest::from_problem(problem, 1e-12).atol[0];
        assert_eq!(PeerRequest::from_problem(&problem(), 1e-12).atol, [1e-13, 3e-10]);
        assert_eq!(depth_tolerance(&Problem { exit_depth: 0.05, ..problem() }), 5e-14);
        let tunnel = Problem { stages: smallvec![Stage::tunnel(9e5, 0.0)], crater: None, ..problem() };
        assert_eq!(depth_tolerance(&tunnel), 1e-13);
        let nothing = Problem { stages: smallvec![Stage::crater(1e7, f64::INFINITY)], ..tunnel };
        assert_eq!(depth_tolerance(&nothing), 1e-12);
    }

    #[test]
    fn a_stage_end_of_a_peer_is_our_crater_end() {
        let at = r#""depth_m": 0.1, "velocity_m_s": 150"#;
        let stage_end = format!(r#"[{{"event": "stage-end", "stage": 0, "time_s": 4.0e-4, {at}}}]"#);
        let crater_end = format!(r#"[{{"event": "crater-end", "time_s": 4.4e-4, {at}}}]"#);
        let theirs = answer(Outcome::Stopped, 0.0, &stage_end);
        let ours = answer(Outcome::StoppedInTunnel, 0.0, &crater_end);
        let differences = theirs.differences_from(&ours.flight(&problem()), &problem()).unwrap();
        let time = differences.iter().find(|d| d.quantity == "crater-end time").unwrap();
        approx::assert_relative_eq!(time.relative, 1.0 / 11.0, max_relative = 1e-12);
        // 150 m/s of 300 are left there: the time of the passage magnifies an error of the energy twice.
        assert_eq!(time.conditioning, 2.0);
        assert!(differences.iter().filter(|d| d.quantity != "crater-end time").all(|d| d.relative == 0.0));
    }

    #[test]
    fn whoever_lists_events_lists_each_boundary_and_whoever_lists_none_leaves_out_none() {
        let crater_end = r#"{"event": "crater-end", "time_s": 4e-4, "depth_m": 0.1, "velocity_m_s": 150}"#;
        let rest = r#"{"event": "rest", "time_s": 1e-3, "depth_m": 0.2, "velocity_m_s": 0}"#;
        let of = |events: &str| answer(Outcome::Stopped, 0.0, events);
        let ours = of(&format!("[{crater_end}, {rest}]")).flight(&problem());
        let left_out = |events: String| of(&events).left_out(&ours, &problem()).map(|event| event.kind);
        assert_eq!(left_out(format!("[{rest}]")), Some(EventKind::CraterEnd));
        assert_eq!(left_out(format!("[{crater_end}]")), None, "rest is the end");
        assert_eq!(left_out("[]".to_owned()), None);
        let as_stage_end = crater_end.replace("crater-end\"", "stage-end\", \"stage\": 0");
        assert_eq!(left_out(format!("[{as_stage_end}, {rest}]")), None);
        let with_stage = crater_end.replace("crater-end\"", "crater-end\", \"stage\": 0");
        assert_eq!(left_out(format!("[{with_stage}, {rest}]")), None);
        // Not told which stage is the crater, a peer may call the first one so.
        let layered = Problem { crater: None, ..problem() };
        let named = of(&format!("[{crater_end}, {rest}]"));
        let as_listed = of(&format!("[{as_stage_end}, {rest}]")).flight(&layered);
        assert_eq!(named.left_out(&as_listed, &layered), None);
        assert_eq!(named.flight(&layered).events, as_listed.events);
        // Also where the crater is a later stage, whether the flight gets there or not.
        let thin = Stage { end: 0.04, ..problem().stages[0] };
        let stages = [thin, problem().stages[0], problem().stages[1]].into_iter().collect();
        let behind = Problem { stages, crater: Some(1), ..problem() };
        let first = crater_end.replace("0.1", "0.04");
        let kinds = |events: &str| of(events).flight(&behind).events.iter().map(|event| event.kind).collect::<Vec<_>>();
        assert_eq!(kinds(&format!("[{first}, {rest}]")), [EventKind::StageEnd(0), EventKind::Rest]);
        assert_eq!(kinds(&format!("[{crater_end}, {rest}]")), [EventKind::CraterEnd, EventKind::Rest]);
        let second = as_stage_end.replace("\"stage\": 0", "\"stage\": 1");
        assert_eq!(
            kinds(&format!("[{first}, {second}, {rest}]")),
            [EventKind::StageEnd(0), EventKind::CraterEnd, EventKind::Rest]
        );
    }

    #[test]
    fn an_event_that_the_reference_lacks_differs_by_its_distance_from_the_end() {
        let invented = r#"[{"event": "crater-end", "time_s": 4.0e-4, "depth_m": 0.1, "velocity_m_s": 150}]"#;
        let theirs = answer(Outcome::Stopped, 0.0, invented);
        let ours = answer(Outcome::StoppedInTunnel, 0.0, "null").flight(&problem());
        let differences = theirs.differences_from(&ours, &problem()).unwrap();
        let of = |name: &str| differences.iter().find(|d| d.quantity == name).unwrap().relative;
        assert_eq!(of("crater-end depth"), ((0.1 - ours.end.depth) / ours.end.depth).abs());
        assert!(of("crater-end depth") > 0.1 && of("crater-end velocity") == 0.5);
    }

    #[test]
    fn a_stop_and_a_perforation_cannot_be_compared() {
        let stopped = answer(Outcome::Stopped, 0.0, "null");
        let perforated = answer(Outcome::Perforated, 3.0, "null");
        assert_eq!(stopped.differences_from(&perforated.flight(&problem()), &problem()), None);
    }

    #[test]
    fn a_barely_perforating_flight_is_badly_conditioned_in_time_and_velocity_alone() {
        let perforated = answer(Outcome::Perforated, 0.3, "null");
        let differences = perforated.differences_from(&perforated.flight(&problem()), &problem()).unwrap();
        let conditioning: Vec<_> = differences.iter().map(|d| d.conditioning).collect();
        assert_eq!(conditioning, [1.0, 1000.0, 1000.0]);
    }

    #[test]
    fn conditioning_is_never_below_one_where_a_drive_speeds_the_projectile_up() {
        let driven = answer(Outcome::Perforated, 900.0, "null");
        let differences = driven.differences_from(&driven.flight(&problem()), &problem()).unwrap();
        assert!(differences.iter().all(|d| d.conditioning == 1.0), "{differences:?}");
    }

    #[test]
    fn equal_zeros_differ_by_nothing_and_a_value_beside_an_exact_zero_by_everything() {
        let at_impact = PeerAnswer { depth_m: 0.0, time_s: 0.0, ..answer(Outcome::Perforated, 300.0, "null") };
        let beside = PeerAnswer { time_s: 1e-9, ..at_impact.clone() };
        let relative = |ours: &PeerAnswer| -> Vec<f64> {
            ours.differences_from(&at_impact.flight(&problem()), &problem())
                .unwrap()
                .iter()
                .map(|d| d.relative)
                .collect()
        };
        assert_eq!(relative(&at_impact), [0.0, 0.0, 0.0]);
        assert_eq!(relative(&beside), [0.0, f64::INFINITY, 0.0]);
    }
}
