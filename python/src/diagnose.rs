//! A solver that is a callable: asked in this process what a program would be asked over its pipes.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use penetrode::cli::diagnose::DiagnoseArgs;
use penetrode::cli::report_args::ReportArgs;
use penetrode::cli::{Called, CliError};
use penetrode::exchange::peers::wire::PeerScene;
use penetrode::exchange::peers::{PeerAnswer, PeerFailure, PeerFault, PeerIdentity, PeerRequest};
use penetrode::physics::{Event, EventKind, State};
use penetrode::studies::diagnosis::Solver;
use pyo3::exceptions::{PyKeyboardInterrupt, PySystemExit};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};

use crate::errors::{command_error, option_error, run_error};
use crate::scene::{Scene, loads};

/// How often a long call looks whether it was interrupted.
const POLL: Duration = Duration::from_millis(20);

/// A stage of a problem: F = static_force + stiffness x + viscosity V + drag V^2 until x = end.
///
/// Attributes
/// ----------
/// static_force : float
///     [N], of any sign; negative drives the projectile.
/// stiffness : float
///     [N/m]; x is counted from the impact face in every stage.
/// viscosity : float
///     [kg/s].
/// drag : float
///     [kg/m].
/// end : float
///     Depth where it ends [m]; ``math.inf`` in the last.
#[pyclass(frozen, get_all, module = "penetrode")]
pub struct Stage {
    static_force: f64,
    stiffness: f64,
    viscosity: f64,
    drag: f64,
    end: f64,
}

#[pymethods]
impl Stage {
    /// Force [N] at depth `x` [m] and velocity `v` [m/s].
    fn force(&self, x: f64, v: f64) -> f64 {
        self.static_force + self.stiffness * x + (self.viscosity + self.drag * v) * v
    }

    fn __repr__(&self) -> String {
        let Self { static_force, stiffness, viscosity, drag, end } = self;
        format!("<Stage F = {static_force} + {stiffness} x + {viscosity} V + {drag} V^2 until x = {end}>")
    }
}

/// What a solver is asked: the flight of a mass through stages, M dV/dt = -F(x, V), x(0) = 0, V(0) = velocity.
///
/// Attributes
/// ----------
/// mass : float
///     M [kg].
/// velocity : float
///     Impact velocity V0 [m/s].
/// exit_depth : float
///     Depth of the far side [m]; ``math.inf`` where there is none.
/// stages : list of Stage
///     In order; the last has no end.
/// rtol : float
///     Relative tolerance asked for.
/// atol : tuple of (float, float)
///     Absolute tolerances of depth [m] and velocity [m/s].
/// dt : float or None
///     The step [s] that a solver of fixed steps must use.
/// scene : dict or None
///     The numbers of the physical scene that the stages stem from.
#[pyclass(frozen, module = "penetrode")]
pub struct Problem {
    request: PeerRequest,
}

#[pymethods]
impl Problem {
    /// What a solver is asked of a scene.
    ///
    /// Parameters
    /// ----------
    /// scene : Scene
    ///     With an impact velocity, and without a law of its own.
    /// rtol : float, default 1e-9
    ///     Relative tolerance.
    /// dt : float, optional
    ///     Step [s] of a solver of fixed steps.
    ///
    /// Returns
    /// -------
    /// Problem
    ///
    /// Raises
    /// ------
    /// OptionError, SceneError
    ///     The scene has a law of its own, or no impact velocity.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> len(pn.Problem.of(pn.scene("tunnel")).stages)
    /// 2
    #[staticmethod]
    #[pyo3(signature = (scene, rtol=1e-9, dt=None))]
    fn of(py: Python<'_>, scene: &Bound<'_, Scene>, rtol: f64, dt: Option<f64>) -> PyResult<Self> {
        let scene = scene.get();
        let problem = scene.problem(py)?;
        if !problem.laws.is_empty() {
            let message = "a solver is told the coefficients of stages, and a stage has a law of its own";
            return Err(option_error(py, message, "take a scene without one"));
        }
        let told = PeerScene::of(&scene.inner.scene);
        Ok(Self { request: PeerRequest { dt_s: dt, scene: told, ..PeerRequest::from_problem(problem, rtol) } })
    }

    #[getter]
    fn mass(&self) -> f64 {
        self.request.mass_kg
    }

    #[getter]
    fn velocity(&self) -> f64 {
        self.request.velocity_m_s
    }

    #[getter]
    fn exit_depth(&self) -> f64 {
        self.request.exit_depth_m.unwrap_or(f64::INFINITY)
    }

    #[getter]
    fn stages(&self) -> Vec<Stage> {
        let stage = |stage: &penetrode::Stage| {
            let &penetrode::Stage { static_force, stiffness, viscosity, drag, end } = stage;
            Stage { static_force, stiffness, viscosity, drag, end }
        };
        self.request.stages.iter().map(stage).collect()
    }

    #[getter]
    fn rtol(&self) -> f64 {
        self.request.rtol
    }

    #[getter]
    fn atol(&self) -> (f64, f64) {
        self.request.atol.into()
    }

    #[getter]
    fn dt(&self) -> Option<f64> {
        self.request.dt_s
    }

    #[getter]
    fn scene<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let scene = self.request.scene.as_ref();
        scene.map(|scene| loads(py, &serde_json::to_string(scene).unwrap_or_default())).transpose()
    }

    fn __repr__(&self) -> String {
        let PeerRequest { mass_kg, velocity_m_s, stages, .. } = &self.request;
        format!("<Problem: {mass_kg} kg at {velocity_m_s} m/s through {} stages>", stages.len())
    }
}

/// What passes between the thread of the callable and the one that waits.
enum Word {
    /// A question was put to the callable, or answered.
    Asked(bool),
    /// The end.
    Done(Box<Result<Called, CliError>>, Seen),
}

/// What came of the questions.
#[derive(Default)]
struct Seen {
    /// Answers that were numbers.
    answers: usize,
    /// Why the first answer was none.
    fault: Option<String>,
    /// An interrupt or an exit that the callable raised: passed on.
    raised: Option<PyErr>,
}

/// A callable as a solver.
struct Callable {
    call: Py<PyAny>,
    name: String,
    identity: PeerIdentity,
    words: Sender<Word>,
    seen: Seen,
}

impl Solver for Callable {
    fn identity(&self) -> PeerIdentity {
        self.identity.clone()
    }

    fn command(&self) -> String {
        self.name.clone()
    }

    fn ask(&mut self, request: &PeerRequest) -> Result<PeerAnswer, PeerFailure> {
        let failed = |fault| PeerFailure { peer: self.name.clone(), fault, stderr: String::new() };
        if self.seen.raised.is_some() {
            return Err(failed(PeerFault::Died("it was interrupted".to_owned())));
        }
        let _ = self.words.send(Word::Asked(true));
        let answer = Python::attach(|py| {
            let made = Bound::new(py, Problem { request: request.clone() })
                .and_then(|problem| self.call.call1(py, (problem,)));
            match made {
                Ok(answer) => {
                    read(answer.bind(py), request).map_err(|why| PeerFault::Nonsense { why, printed: String::new() })
                }
                Err(error) => {
                    let why = described(py, &error);
                    let is_passed_on =
                        error.is_instance_of::<PyKeyboardInterrupt>(py) || error.is_instance_of::<PySystemExit>(py);
                    if is_passed_on {
                        self.seen.raised = Some(error);
                    }
                    Err(if is_passed_on { PeerFault::Died(why) } else { PeerFault::Reported(why) })
                }
            }
        });
        let _ = self.words.send(Word::Asked(false));
        match &answer {
            Ok(_) => self.seen.answers += 1,
            Err(fault) => {
                self.seen.fault.get_or_insert_with(|| fault.to_string());
            }
        }
        answer.map_err(failed)
    }

    fn restart(&mut self) -> bool {
        self.seen.raised.is_none()
    }
}

/// An exception in one line: its type, what it says, and where it was raised.
fn described(py: Python<'_>, error: &PyErr) -> String {
    let kind = error.get_type(py).name().map_or_else(|_| "an exception".to_owned(), |name| name.to_string());
    let mut place = String::new();
    let mut next = error.traceback(py).map(Bound::into_any);
    // Ends with the trace; the innermost frame raised it.
    while let Some(at) = next {
        let line = at.getattr("tb_lineno").and_then(|line| line.extract::<usize>());
        let file = at
            .getattr("tb_frame")
            .and_then(|frame| frame.getattr("f_code")?.getattr("co_filename")?.extract::<String>());
        if let (Ok(line), Ok(file)) = (line, file) {
            place = format!(" ({file}:{line})");
        }
        next = at.getattr("tb_next").ok().filter(|next| !next.is_none());
    }
    let text = penetrode::text::shortened(&error.value(py).to_string());
    format!("{kind}: {text}{place}")
}

/// The answer that a callable gave: depth, time and velocity in a row, or by name.
fn read(given: &Bound<'_, PyAny>, request: &PeerRequest) -> Result<PeerAnswer, String> {
    let wanted = "not depth (m), time (s) and velocity (m/s)";
    if given.is_none() {
        return Err(format!("it returns None, {wanted}"));
    }
    let kind = || given.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
    let by_name = given.cast::<PyMapping>().ok();
    let item = |name: &str| by_name.and_then(|map| map.get_item(name).ok()).filter(|item| !item.is_none());
    let numbers: [f64; 3] = match by_name {
        Some(_) => {
            let number = |name: &str| {
                let item = item(name).ok_or_else(|| format!("it returns a dict without `{name}`"))?;
                item.extract().map_err(|_| format!("`{name}` is no number"))
            };
            [number("depth_m")?, number("time_s")?, number("velocity_m_s")?]
        }
        None => {
            let parts = given.try_iter().map_err(|_| format!("it returns a {}, {wanted}", kind()))?;
            let parts: Vec<f64> = parts
                .map(|part| part.and_then(|part| part.extract()))
                .collect::<PyResult<_>>()
                .map_err(|_| format!("it returns a {} that holds no number, {wanted}", kind()))?;
            <[f64; 3]>::try_from(parts).map_err(|parts| format!("it returns {} numbers, {wanted}", parts.len()))?
        }
    };
    for (name, number) in ["depth", "time", "velocity"].into_iter().zip(numbers) {
        if !number.is_finite() {
            return Err(format!("its {name} is {number}"));
        }
    }
    let [depth_m, time_s, velocity_m_s] = numbers;
    let outcome = match item("outcome") {
        None => request.outcome_at(depth_m),
        Some(name) => {
            let json = name.extract::<String>().map(|name| serde_json::Value::String(name)).unwrap_or_default();
            serde_json::from_value(json).map_err(|_| "its outcome is no outcome: stopped, perforated".to_owned())?
        }
    };
    let events = item("events").map(|events| events_of(&events)).transpose()?.unwrap_or_default();
    let force_evaluations = item("force_evaluations").and_then(|count| count.extract().ok());
    Ok(PeerAnswer {
        outcome,
        depth_m,
        time_s,
        velocity_m_s,
        events,
        force_evaluations,
        wall_ns: None,
        wall_ns_quartiles: None,
    })
}

/// Events as `(name, stage or None, time, depth, velocity)` each.
fn events_of(given: &Bound<'_, PyAny>) -> Result<Vec<Event>, String> {
    let wanted = "its events are not (name, stage, time, depth, velocity) each";
    let event = |given: PyResult<Bound<'_, PyAny>>| {
        let parts = given.and_then(|given| given.extract::<(String, Option<usize>, f64, f64, f64)>());
        let (name, stage, time, depth, velocity) = parts.map_err(|_| wanted.to_owned())?;
        let kind = match (name.as_str(), stage) {
            ("stage-end", Some(stage)) => EventKind::StageEnd(stage),
            ("exit", _) => EventKind::Exit,
            ("rest", _) => EventKind::Rest,
            _ => return Err(wanted.to_owned()),
        };
        Ok(Event { kind, state: State { time, depth, velocity } })
    };
    given.try_iter().map_err(|_| wanted.to_owned())?.map(event).collect()
}

/// Diagnoses a callable; `penetrode.diagnose` is for people.
///
/// Parameters
/// ----------
/// solver : callable
///     Of a `Problem`, to depth, time and velocity.
/// name : str
///     Whose it is.
/// seed, questions : int
///     As in the command.
/// fixed_step : bool
///     Whether it takes ``problem.dt`` as its step.
/// reads_scene : bool
///     Whether only physical scenes are asked.
/// orders : dict of (str, float)
///     Orders claimed, ``all`` or by quantity.
/// out : os.PathLike or None
///     Folder of the report.
/// silence : float
///     Longest wait for one answer [s].
///
/// Returns
/// -------
/// tuple of (dict, str, int, list of str)
///     As `call`.
#[pyfunction]
#[pyo3(signature = (solver, name, seed, questions, fixed_step, reads_scene, orders, out, silence))]
#[expect(clippy::too_many_arguments, reason = "the options of the command")]
pub fn diagnose<'py>(
    py: Python<'py>,
    solver: Py<PyAny>,
    name: String,
    seed: u64,
    questions: u32,
    fixed_step: bool,
    reads_scene: bool,
    orders: &Bound<'py, PyDict>,
    out: Option<std::path::PathBuf>,
    silence: f64,
) -> PyResult<(Bound<'py, PyAny>, String, u8, Vec<String>)> {
    let claimed_orders = orders.extract()?;
    let identity = PeerIdentity {
        name: name.clone(),
        version: String::new(),
        method: String::new(),
        fixed_step,
        reads_scene,
        claimed_orders,
    };
    let (words, mut heard) = channel();
    let mut callable = Callable { call: solver, name, identity, words: words.clone(), seen: Seen::default() };
    let arguments = DiagnoseArgs { command: callable.name.clone(), seed, questions, report: ReportArgs { out } };
    let worker = thread::Builder::new().name("penetrode".to_owned()).stack_size(16 << 20).spawn(move || {
        // The thread keeps its place in the interpreter, so that a question costs no more than the call.
        Python::attach(|py| {
            let answer = py.detach(|| {
                arguments.report.check("diagnose", &[])?;
                Called::new(arguments.of(&mut callable)?)
            });
            let _ = words.send(Word::Done(Box::new(answer), callable.seen));
        });
    });
    worker.map_err(|error| run_error(py, &error.to_string(), "end other programs first"))?;
    let (answer, seen) = wait(py, &mut heard, Duration::from_secs_f64(silence.clamp(1e-3, 1e9)))?;
    if let Some(raised) = seen.raised {
        return Err(raised);
    }
    let called = answer.map_err(|error| command_error(py, "OptionError", &error))?;
    if let Some(fault) = seen.fault.filter(|_| seen.answers == 0) {
        let message = format!("the solver answers no question: it {fault}").replace("it it ", "it ");
        return Err(run_error(py, &message, "return depth (m), time (s) and velocity (m/s) at the end of the flight"));
    }
    let data = loads(py, called.json.as_deref().unwrap_or("null"))?;
    Ok((data, called.text, called.exit as u8, Vec::new()))
}

/// Waits for the end; an interrupt ends the wait, and so does a question that is not answered in time.
fn wait(py: Python<'_>, heard: &mut Receiver<Word>, silence: Duration) -> PyResult<(Result<Called, CliError>, Seen)> {
    let mut since = None;
    loop {
        let receiver = &mut *heard;
        match py.detach(move || receiver.recv_timeout(POLL)) {
            Ok(Word::Asked(is_asked)) => since = is_asked.then(Instant::now),
            Ok(Word::Done(answer, seen)) => return Ok((*answer, seen)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(run_error(py, "the diagnosis broke off", "report it with the solver that did it"));
            }
        }
        py.check_signals()?;
        if since.is_some_and(|since: Instant| since.elapsed() > silence) {
            let message = format!("the solver was silent for {} s", silence.as_secs_f64());
            return Err(run_error(py, &message, "it hangs on a question; a longer wait: silence=120"));
        }
    }
}
