//! `penetrode solve`: one scene solved, beside the exact answer.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::method_args::{MethodArgs, MethodJson};
use super::output::{Text, check_outputs, engineering, error_text, say, significant, write_table};
use super::scene_json::{ForceJson, SceneJson};
use super::sensitivities::SensitivitiesJson;
use super::{Answer, Ask, CliError, Exit, SceneArgs};
use crate::exchange::input::name_of;
use crate::exchange::scene_file::SceneFile;
use crate::exchange::tables::{self, Column, Format, Kind, Others, Value, table_of};
use crate::integrators::{ClosedForm, Cost, Detail, Flight, Integrator, Method, MethodName, Sample};
use crate::physics::ball::Ball;
use crate::physics::groups::Groups;
use crate::physics::{Criterion, Event, EventKind, Outcome, Range, Scene, Shown, State};
use crate::studies::applicability;
use crate::studies::boxes::{BoxError, Outcomes, Ranges, Region, Side};
use crate::studies::enclosure::{self, Intervals};
use crate::studies::error::flight_error;
use crate::studies::quantity::Quantity;
use crate::text::{count, digits_between};

/// Arguments of `solve`.
#[derive(Args, Debug)]
#[command(after_help = "Example: penetrode solve tunnel --points 200 --trajectory path.csv")]
pub struct SolveArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Method and its options.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Write every step and event to this CSV file.
    ///
    /// - is standard output, in place of the answer.
    #[arg(long, value_name = "F.csv")]
    pub trajectory: Option<PathBuf>,
    /// In place of steps N states, evenly in time.
    ///
    /// From impact to the end, both included. They are the method's own solution inside its steps, as accurate as the steps themselves; central-difference has
    /// none, and runs V linearly and x along the parabola that meets both nodes. Without --trajectory they are in the
    /// answer.
    #[arg(long, value_name = "N", conflicts_with = "times", value_parser = clap::value_parser!(u32).range(2..=10_000_000))]
    pub points: Option<u32>,
    /// The same at the times (time_s) of this CSV file.
    ///
    /// Times behind the end are left out, with a warning.
    #[arg(long, value_name = "FILE")]
    pub times: Option<PathBuf>,
    /// enclosure: the range of every answer for target.strength=34MPa:38MPa; repeatable.
    ///
    /// The number lies anywhere between the two values, whatever the others do in theirs.
    #[arg(long = "box", value_name = "PATH=A:B", conflicts_with_all = ["trajectory", "points", "times"])]
    pub sides: Vec<String>,
    /// Say what the scene let the method skip, and why.
    #[arg(long)]
    pub explain: bool,
    /// Derivatives with respect to every number.
    ///
    /// Of the depth or the residual velocity, and of the critical velocity.
    #[arg(long)]
    pub sensitivities: bool,
}

/// What `solve --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SolveJson {
    schema: &'static str,
    scene: SceneJson,
    groups: GroupsJson,
    method: MethodJson,
    outcome: OutcomeJson,
    stage: usize,
    #[serde(flatten)]
    end: State,
    /// Speed at x = H (m/s) where the criterion has the exit elsewhere and the projectile gets there; else `null`.
    velocity_at_far_side_m_s: Option<f64>,
    /// Least W = V² over V0² at the stage ends and the exit, below zero for a stop: the exit energy unless a stage drives.
    exit_margin: Option<f64>,
    /// Half-width of its error bound.
    exit_margin_error: Option<f64>,
    events: Vec<Event>,
    cost: CostJson,
    closed_form: Option<ClosedFormJson>,
    relative_error: Option<RelativeErrorJson>,
    /// Asked for with `--points` or `--times`; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    trajectory: Option<Vec<Sample>>,
    skipped: Vec<String>,
    /// With `--method enclosure`: between which numbers the exact answers lie, of the numbers as written.
    #[serde(skip_serializing_if = "Option::is_none")]
    enclosure: Option<EnclosureJson>,
    /// With `--box`: the numbers that vary, and from which value to which; outcome and enclosure are those of all of it.
    #[serde(rename = "box", skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(default)]
    sides: BTreeMap<String, (f64, f64)>,
    /// The same slab by other criteria, with the criterion `plug`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    criteria: Vec<ByCriterionJson>,
    /// Asked for with `--sensitivities`; `null` otherwise.
    sensitivities: Option<SensitivitiesJson>,
}

/// How the projectile ends.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OutcomeJson {
    /// So.
    One(Outcome),
    /// At some points of a box it stops, at others it perforates.
    Either(Either),
}

/// The word for both.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Either {
    /// Stopped or perforated.
    Either,
}

impl OutcomeJson {
    fn name(self) -> &'static str {
        match self {
            Self::One(outcome) => outcome.name(),
            Self::Either(_) => "either",
        }
    }
}

/// What is proved of a flight.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EnclosureJson {
    /// At the end.
    #[serde(flatten)]
    end: Intervals,
    /// The events, in time order; none of a box.
    events: Vec<EnclosedEventJson>,
}

/// What is proved of an event.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EnclosedEventJson {
    /// What happened.
    #[serde(flatten)]
    kind: EventKind,
    /// When and where.
    #[serde(flatten)]
    state: Intervals,
}

impl EnclosureJson {
    fn new(flight: &Flight<Ball>) -> Self {
        let event = |event: &Event<Ball>| EnclosedEventJson { kind: event.kind, state: Intervals::of(&event.state) };
        Self { end: Intervals::of(&flight.end), events: flight.events.iter().map(event).collect() }
    }

    fn of_box(ranges: Option<Ranges>) -> Self {
        let anything = (Some(0.0), None);
        let unproved = Intervals { depth_m: anything, time_s: anything, velocity_m_s: anything };
        Self { end: ranges.map_or(unproved, |ranges| ranges.end), events: Vec::new() }
    }

    /// The digits that are certain, and those that are not.
    fn add_to(&self, text: &mut Text, is_proved: bool) {
        let Intervals { depth_m, time_s, velocity_m_s } = self.end;
        let what = if is_proved { "proved" } else { "not ruled out" };
        for (name, unit, (low, high)) in
            [("depth", "m", depth_m), ("time", "s", time_s), ("velocity", "m/s", velocity_m_s)]
        {
            let low = low.unwrap_or(0.0);
            let shown = high.map_or_else(|| format!("from {}", Shown(low)), |high| digits_between(low, high));
            text.line(format!("  {what}   {name:8} {shown} {unit}"));
        }
    }
}

/// The outcome by another criterion, and the velocity at its end.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ByCriterionJson {
    criterion: &'static str,
    outcome: Outcome,
    velocity_m_s: f64,
}

/// The groups of Eq. 13; `null` where the scene has none.
#[derive(Debug, Serialize, JsonSchema)]
#[expect(non_snake_case, reason = "the groups are named as in the paper")]
pub struct GroupsJson {
    I: Option<f64>,
    N: Option<f64>,
    H_over_d: Option<f64>,
    X_over_d: Option<f64>,
    /// Of Eq. 11-12, the limit N -> infinity, without a far side.
    X_over_d_eq11_12: Option<f64>,
    /// M/(rho d³), N as Eq. 13 prints it: without N* and B.
    N_without_nose: Option<f64>,
    /// Johnson number rho V0²/fc.
    johnson: Option<f64>,
}

/// Work done.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CostJson {
    /// Counted.
    #[serde(flatten)]
    pub cost: Cost,
    /// Time taken (ns).
    pub wall_ns: u64,
}

/// The exact answer.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ClosedFormJson {
    outcome: Outcome,
    #[serde(flatten)]
    end: State,
    crater_end_time_s: Option<f64>,
    crater_end_velocity_m_s: Option<f64>,
}

/// Errors against the exact answer: depth and times relative to it, velocities relative to V0.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RelativeErrorJson {
    depth: Option<f64>,
    time: Option<f64>,
    velocity: Option<f64>,
    crater_end_time: Option<f64>,
    crater_end_velocity: Option<f64>,
}

impl RelativeErrorJson {
    /// Errors of `flight` against `exact`, at impact speed `impact_speed` (m/s); `None` where the outcomes differ.
    fn new(flight: &Flight, exact: &Flight, impact_speed: f64) -> Option<Self> {
        let error = |quantity| flight_error(quantity, flight, exact, impact_speed).map(f64::abs);
        let [depth, time, velocity, crater_end_time, crater_end_velocity] = Quantity::OF_A_FLIGHT.map(error);
        // The time of an arrival that is in doubt is no number to compare: it may be infinite.
        let time = time.filter(|_| flight.outcome != Outcome::Undecided);
        let errors = Self { depth, time, velocity, crater_end_time, crater_end_velocity };
        flight.outcome.agrees_with(exact.outcome).then_some(errors)
    }
}

impl GroupsJson {
    /// The groups of `scene` at `impact_speed` (m/s), which ended at `depth` (m).
    pub fn new(scene: &Scene, impact_speed: f64, depth: f64) -> Self {
        let groups = Groups::of(scene, impact_speed);
        Self {
            I: groups.map(|g| g.impact),
            N: groups.and_then(|g| g.geometry),
            H_over_d: groups.and_then(|g| g.thickness_ratio),
            X_over_d: scene.concrete().map(|concrete| depth / concrete.diameter),
            X_over_d_eq11_12: groups.map(|g| g.depth_ratio_eq11_12),
            N_without_nose: groups.and_then(|g| g.mass_ratio),
            johnson: groups.map(|g| g.johnson),
        }
    }
}

impl Ask for SolveArgs {
    type Answer = SolveJson;

    fn table(&self) -> Option<&Path> {
        self.trajectory.as_deref()
    }

    fn ask(&self) -> Result<Answer<SolveJson>, CliError> {
        let SceneFile { scene, written } = self.scene.settings.read_file(&self.scene.path)?;
        let problem = scene.problem().map_err(|error| CliError::from(error).in_file(&self.scene.path))?;
        if let Some(path) = &self.trajectory {
            let times = self.times.as_deref().map(|path| ("the times", path));
            let inputs: Vec<_> = [("the scene", Path::new(&self.scene.path))].into_iter().chain(times).collect();
            check_outputs(&inputs, &[("the trajectory", path)])?;
        }
        let method = self.method.build()?;
        let encloses = self.method.method == MethodName::Enclosure;
        let times = self.wanted_times(|| {
            Ok(if encloses {
                enclosure::flight(&scene, &written, Detail::End)??.values().end.time
            } else {
                method.integrator().solve(&problem, Detail::Events)?.end.time
            })
        })?;
        let detail = match &times {
            Some(times) => Detail::Times(times),
            None if self.trajectory.is_some() => Detail::Trajectory,
            None => Detail::Events,
        };
        let started = Instant::now();
        let sides = boxed_sides(&self.sides, encloses)?;
        let ranges = match sides.as_slice() {
            [] => None,
            sides => Some(Region::new(&scene, &written, sides)?.flight()?),
        };
        let enclosed = if encloses { Some(enclosure::flight(&scene, &written, detail)??) } else { None };
        let flight = match &enclosed {
            Some(flight) => flight.values(),
            None => method.integrator().solve(&problem, detail)?,
        };
        let wall_ns = u64::try_from(started.elapsed().as_nanos()).unwrap_or(u64::MAX);
        if let Some(path) = &self.trajectory {
            let table = table_of(&TRAJECTORY, false, flight.trajectory.iter().map(trajectory_row));
            write_table(path, table, &[], [])?;
        }
        let outside = applicability::warnings(&scene, problem.impact_speed);
        for warning in scene.exit_depth_warning().into_iter().chain(outside) {
            say("warning: ", &warning);
        }
        let late = times.as_ref().map_or(0, |times| times.len() - flight.trajectory.len());
        if late > 0 {
            let end = engineering(flight.end.time, "s");
            say("warning: ", &format!("{} left out, behind the end of the flight at {end}", count(late, "time")));
        }
        let sensitivities = self.sensitivities.then(|| SensitivitiesJson::new(&scene)).transpose()?;
        let mut skipped = method.explain(&problem, &flight, detail);
        skipped.retain(|note| sensitivities.is_none() || !note.starts_with("sensitivities"));
        let exact = ClosedForm.solve(&problem, Detail::Events).ok();
        let far_side = velocity_at_far_side(&scene, flight.outcome, &method);
        let data = SolveJson {
            schema: "penetrode/solve/1",
            scene: SceneJson::new(&scene, &problem),
            groups: GroupsJson::new(&scene, problem.impact_speed, flight.end.depth),
            method: MethodJson::new(self.method.method, &self.method.options()?, Some(&problem), Some(&flight)),
            outcome: match ranges {
                None => OutcomeJson::One(flight.outcome),
                Some(None) => OutcomeJson::One(Outcome::Undecided),
                Some(Some(Ranges { outcomes: Outcomes::One(outcome), .. })) => OutcomeJson::One(outcome),
                Some(Some(_)) => OutcomeJson::Either(Either::Either),
            },
            stage: flight.stage,
            end: flight.end,
            velocity_at_far_side_m_s: far_side,
            exit_margin: flight.exit_margin,
            exit_margin_error: flight.exit_margin_error,
            events: flight.events.to_vec(),
            cost: CostJson { cost: flight.cost, wall_ns },
            closed_form: exact.as_ref().map(|exact| ClosedFormJson {
                outcome: exact.outcome,
                end: exact.end,
                crater_end_time_s: exact.crater_end().map(|s| s.time),
                crater_end_velocity_m_s: exact.crater_end().map(|s| s.velocity),
            }),
            relative_error: exact.and_then(|exact| RelativeErrorJson::new(&flight, &exact, problem.impact_speed)),
            trajectory: times.is_some().then(|| flight.trajectory.clone()),
            skipped,
            enclosure: match ranges {
                None => enclosed.as_ref().map(EnclosureJson::new),
                Some(ranges) => Some(EnclosureJson::of_box(ranges)),
            },
            sides: sides.iter().map(|side| (side.parameter.to_string(), (side.low, side.high))).collect(),
            criteria: criteria(&scene, problem.impact_speed, &method),
            sensitivities,
        };
        let is_unstable = flight.step_limit.is_some_and(|limit| !limit.stable);
        let exit = match data.outcome {
            _ if is_unstable => Exit::Criterion,
            OutcomeJson::One(Outcome::Undecided) => Exit::Undecided,
            _ => Exit::Success,
        };
        Ok(Answer { text: self.text(&data, &flight), data: Some(data), exit })
    }
}

/// The sides of a box, which `enclosure` alone takes.
///
/// # Errors
/// A text that is no side (exit 2), and another method.
pub(super) fn boxed_sides(texts: &[String], encloses: bool) -> Result<Vec<Side>, CliError> {
    if !(texts.is_empty() || encloses) {
        return Err(CliError::usage("--box is of --method enclosure alone", "add --method enclosure"));
    }
    Ok(texts.iter().map(|text| text.parse()).collect::<Result<_, BoxError>>()?)
}

/// What `scene` comes to by other criteria, if its own is `plug`.
fn criteria(scene: &Scene, speed: f64, method: &Method) -> Vec<ByCriterionJson> {
    let by = |(criterion, other): (&'static str, Scene)| {
        let flight = method.integrator().solve(&other.resolve(speed).ok()?, Detail::End).ok()?;
        Some(ByCriterionJson { criterion, outcome: flight.outcome, velocity_m_s: flight.end.velocity })
    };
    scene.other_criteria().into_iter().filter_map(by).collect()
}

impl SolveArgs {
    /// The times (s) at which states are asked for, if any are.
    fn wanted_times(&self, end: impl FnOnce() -> Result<f64, CliError>) -> Result<Option<Vec<f64>>, CliError> {
        if let Some(path) = &self.times {
            return Ok(Some(read_times(path)?));
        }
        let Some(points) = self.points else { return Ok(None) };
        let end = end()?;
        let time = |i: u32| end * (f64::from(i) / f64::from(points - 1));
        Ok(Some((0..points).map(time).collect()))
    }

    fn text(&self, data: &SolveJson, flight: &Flight) -> String {
        let mut text = Text::titled(data.scene.title.as_deref());
        text.line(format!("  method   {}", data.method.text()));
        data.add_outcome(&mut text, flight);
        text.lines(data.groups.text(data.scene.velocity_m_s));
        for ForceJson { stage, force } in &data.scene.forces {
            let whose = if data.scene.stages.len() > 1 { format!("stage {stage}: ") } else { String::new() };
            text.wrapped("  force    ", &format!("{whose}{force}"));
        }
        if let Some(plug) = &data.scene.plug {
            let angle = significant(plug.half_angle_deg);
            let strength = engineering(plug.shear_strength_pa, "Pa");
            let left = engineering(plug.static_thickness_m, "m");
            let words = format!("half angle {angle} deg, shear strength {strength}, static thickness {left}");
            text.wrapped("  plug     ", &words);
        }
        for ByCriterionJson { criterion, outcome, velocity_m_s } in &data.criteria {
            let velocity = engineering(*velocity_m_s, "m/s");
            text.line(format!("  by       {criterion}: {outcome}, {velocity}"));
        }
        for end in &data.scene.ends {
            text.wrapped("  end      ", &end.text());
        }
        text.gap();
        let row = |event: &Event| {
            let name = match event.kind {
                EventKind::StageEnd(index) => format!("stage-end {index}"),
                kind => kind.name().to_owned(),
            };
            let State { time, depth, velocity } = event.state;
            [name, engineering(time, "s"), engineering(depth, "m"), engineering(velocity, "m/s")]
        };
        let (first, last) = match flight.events.len() {
            count if count > EVENTS_MAX => (&flight.events[..EVENTS_SHOWN], &flight.events[count - EVENTS_SHOWN..]),
            _ => (&flight.events[..], &flight.events[..0]),
        };
        let left_out = (!last.is_empty()).then(|| {
            let between = count(flight.events.len() - first.len() - last.len(), "stage end");
            [format!("({between})"), String::new(), String::new(), String::new()]
        });
        let rows = first.iter().map(row).chain(left_out).chain(last.iter().map(row));
        text.table(&["event", "time", "depth", "velocity"], rows);
        if let Some(rows) = data.trajectory.as_ref().filter(|_| self.trajectory.is_none()) {
            text.gap();
            let row = |Sample { state: State { time, depth, velocity }, force, .. }: &Sample| {
                [(*time, "s"), (*depth, "m"), (*velocity, "m/s"), (*force, "N")]
                    .map(|(value, unit)| engineering(value, unit))
            };
            text.table(&["time", "depth", "velocity", "force"], rows.iter().map(row));
        }
        text.gap();
        if let Some(enclosure) = &data.enclosure {
            for (path, (low, high)) in &data.sides {
                text.line(format!("  box      {path} from {} to {}", Shown(*low), Shown(*high)));
            }
            enclosure.add_to(&mut text, !matches!(data.outcome, OutcomeJson::One(Outcome::Undecided)));
        }
        data.add_exact(&mut text);
        if flight.outcome == Outcome::Undecided {
            // An enclosure says itself what is open.
            let why = if data.enclosure.is_some() { None } else { Some(UNDECIDED) };
            let notes = flight.notes.iter().map(String::as_str).chain(why);
            notes.for_each(|note| text.wrapped("  note     ", note));
        }
        if let Some(limit) = flight.step_limit.filter(|limit| !limit.stable) {
            text.line(format!("  the step lies beyond the stability limit {}", engineering(limit.limit, "s")));
        }
        let Cost { steps, rejected_steps, force_evaluations } = flight.cost;
        text.line(format!(
            "  cost     {steps} steps, {rejected_steps} rejected, {force_evaluations} force evaluations"
        ));
        if self.explain {
            text.gap();
            text.line("  skipped");
            data.skipped.iter().for_each(|note| text.wrapped("  - ", note));
        }
        if let Some(sensitivities) = &data.sensitivities {
            sensitivities.add_to(&mut text, &data.scene.follows);
        }
        text.finish()
    }
}

impl GroupsJson {
    /// Two lines, where the scene has the groups.
    pub fn text(&self, impact_speed: f64) -> Vec<String> {
        // Where the speed is above zero, I is neither zero nor infinite, only out of range.
        let Some(impact) = self.I else { return Vec::new() };
        let impact = match impact {
            0.0 if impact_speed > 0.0 => "below 1e-323".to_owned(),
            f64::INFINITY => "above 1e308".to_owned(),
            impact => significant(impact),
        };
        let shown = |list: &[(&str, Option<f64>)]| {
            let known = list.iter().filter_map(|(name, value)| Some(format!("{name} {}", significant((*value)?))));
            known.collect::<Vec<_>>().join("   ")
        };
        let groups = shown(&[("N", self.N), ("H/d", self.H_over_d), ("X/d", self.X_over_d)]);
        let beside =
            [("X/d", self.X_over_d_eq11_12), ("N without N*", self.N_without_nose), ("Johnson number", self.johnson)];
        let gap = if groups.is_empty() { "" } else { "   " };
        vec![format!("  groups   I {impact}{gap}{groups}"), format!("  Eq. 11-13  {}", shown(&beside))]
    }
}

impl SolveJson {
    /// The outcome, where the projectile leaves and the exit margin; of a box, also those of the scene itself.
    fn add_outcome(&self, text: &mut Text, flight: &Flight) {
        let place = match (flight.outcome, self.scene.criterion, self.velocity_at_far_side_m_s) {
            (Outcome::Perforated, Criterion::FullDepth | Criterion::Plug, _) => " at x = H".to_owned(),
            (Outcome::Perforated, criterion, far_side) => {
                let beyond = far_side.map_or_else(
                    || "it stops before x = H".to_owned(),
                    |speed| format!("{} at x = H", engineering(speed, "m/s")),
                );
                format!(" at {}; {beyond}", criterion.place())
            }
            _ => String::new(),
        };
        let margin = match self.exit_margin.zip(self.exit_margin_error) {
            Some((margin, bar)) if margin.is_finite() && bar.is_finite() => {
                format!(" (exit margin {} +- {bar:.0e} of V0²)", significant(margin))
            }
            Some(_) => " (the exit margin leaves the range of 64-bit numbers)".to_owned(),
            None => String::new(),
        };
        if self.sides.is_empty() {
            text.line(format!("  outcome  {}{place}{margin}", self.outcome.name()));
        } else {
            text.line(format!("  outcome  {}, in the box", self.outcome.name()));
            let itself = format!("{}{place}{margin}, and so the events and the table below", flight.outcome);
            text.wrapped("  itself   ", &itself);
        }
    }

    /// Adds the end of the solution beside the exact one.
    fn add_exact(&self, text: &mut Text) {
        let Some(exact) = &self.closed_form else {
            return text.line("  no closed form for these stages: compare methods, or refine with `converge`");
        };
        let errors = self.relative_error.as_ref();
        let (ours, theirs) = (self.end, exact.end);
        let rows = [
            ("depth", "m", ours.depth, theirs.depth, errors.and_then(|e| e.depth)),
            ("time", "s", ours.time, theirs.time, errors.and_then(|e| e.time)),
            ("velocity", "m/s", ours.velocity, theirs.velocity, errors.and_then(|e| e.velocity)),
        ];
        let rows = rows.map(|(name, unit, ours, theirs, error)| {
            [name.to_owned(), engineering(ours, unit), engineering(theirs, unit), error_text(error)]
        });
        text.table(&["at the end", self.method.name, "closed form", "error"], rows);
        text.lines(errors.is_none().then(|| format!("  the closed form says {}", exact.outcome)));
    }
}

/// Most events that are shown one by one; a table of a force has thousands.
const EVENTS_MAX: usize = 60;

/// How many of more are shown from each end.
const EVENTS_SHOWN: usize = 8;

/// Speed (m/s) at x = H of a projectile that perforated by a criterion with another exit; `None` where it stops before, and
/// with the criterion x = H.
fn velocity_at_far_side(scene: &Scene, outcome: Outcome, method: &Method) -> Option<f64> {
    if scene.criterion == Criterion::FullDepth || outcome != Outcome::Perforated {
        return None;
    }
    let whole = Scene { criterion: Criterion::FullDepth, ..scene.clone() };
    let flight = method.integrator().solve(&whole.problem().ok()?, Detail::End).ok()?;
    (flight.outcome == Outcome::Perforated).then_some(flight.end.velocity)
}

/// What would decide an outcome that is undecided.
const UNDECIDED: &str = "the exit margin lies within its error bound: this speed is V_c to the accuracy of the method. A \
                         smaller error may decide it, another speed or thickness will";

/// Times of one's own.
static TIMES: Format = Format {
    columns: &[Column::number("time_s").within(Range::NotNegative)],
    others: Others::Ignored,
    has_comments: true,
};

/// The times (s) in the table at `path`, ascending.
fn read_times(path: &Path) -> Result<Vec<f64>, CliError> {
    let mut last = 0.0;
    let times = tables::read(&name_of(path), &tables::read_bytes(path, &TIMES)?, &TIMES, |row| {
        let time = row.number(0)?;
        if time < last {
            return Err(row.refuse_cell(0, row.text(0)?, "less than the time above it"));
        }
        last = time;
        Ok(time)
    });
    Ok(times?)
}

/// The columns of a trajectory: a row for each step and each event, or for each time that was asked for.
const TRAJECTORY: [(&str, Kind); 5] = [
    ("time_s", Kind::Number),
    ("depth_m", Kind::Number),
    ("velocity_m_s", Kind::Number),
    ("force_n", Kind::Number),
    ("stage", Kind::Count),
];

fn trajectory_row(sample: &Sample) -> Vec<Value<'static>> {
    let State { time, depth, velocity } = sample.state;
    let numbers = [time, depth, velocity, sample.force].map(|number| Value::Number(Some(number)));
    numbers.into_iter().chain([Value::Count(sample.stage as u64)]).collect()
}
