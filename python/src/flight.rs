//! One flight: solved by the library, its states at any times or depths by the method that solved it.

use std::sync::LazyLock;

use numpy::{PyArray1, PyReadonlyArray1};
use penetrode::integrators::{Flight as Solution, Method, MethodName, MethodOptions, Sample};
use penetrode::report::flight_figure::of_flight;
use penetrode::{Detail, IntegrationError, Problem};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::{advised, command_error, option_error};
use crate::interruptible;
use crate::scene::Scene;
use crate::studies::{Answer, answer};

/// The method that nothing was said of.
static TAYLOR: LazyLock<Method> =
    LazyLock::new(|| Method::new(MethodName::Taylor, &MethodOptions::default()).unwrap_or_else(|_| unreachable!()));

/// States that are drawn.
const DRAWN: usize = 200;

/// Name and options of a method, as Python gives them.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    name: MethodName,
    options: MethodOptions,
}

impl Chosen {
    /// The method of this name with these options.
    pub fn new(
        py: Python<'_>,
        method: &str,
        rtol: Option<f64>,
        dt: Option<&Bound<'_, PyAny>>,
        velocity: Option<&str>,
        events: Option<&str>,
    ) -> PyResult<Self> {
        if method == "taylor" && rtol.is_none() && dt.is_none() && velocity.is_none() && events.is_none() {
            return Ok(Self { name: MethodName::Taylor, options: MethodOptions::default() });
        }
        let name = method.parse().map_err(|_| {
            let names = MethodName::built().map(MethodName::name).collect::<Vec<_>>().join(", ");
            option_error(py, &format!("there is no method {method:?}"), &format!("choose among {names}"))
        })?;
        let word = |name: &str, given: &str, allowed: &str| {
            option_error(py, &format!("{name} = {given:?} is not allowed"), &format!("choose among {allowed}"))
        };
        let velocity = velocity
            .map(|text| text.parse().map_err(|_| word("velocity", text, "lagged, centred, predicted")))
            .transpose()?;
        let events = events
            .map(|text| text.parse().map_err(|_| word("events", text, "step-end, interpolated, landed")))
            .transpose()?;
        let options = MethodOptions { rtol, dt: dt.map(|dt| step(py, dt)).transpose()?, velocity, events, steps: None };
        let chosen = Self { name, options };
        chosen.build().map_err(|error| advised(py, "OptionError", &error))?;
        Ok(chosen)
    }

    /// Whether it is the method that nothing was said of.
    pub fn is_plain(&self) -> bool {
        self.name == MethodName::Taylor && self.options == MethodOptions::default()
    }

    /// It, ready to solve.
    pub fn build(&self) -> Result<Method, IntegrationError> {
        Method::new(self.name, &self.options)
    }

    /// The words of a command line that choose it.
    fn words(&self) -> Vec<String> {
        let MethodOptions { rtol, dt, velocity, events, steps: _ } = &self.options;
        let rtol = rtol.map(|rtol| format!("--rtol={rtol:?}"));
        let dt = dt.map(|dt| format!("--dt={dt:?}"));
        let velocity = velocity.map(|velocity| format!("--velocity={}", velocity.name()));
        let events = events.map(|events| format!("--events={}", events.name()));
        let method = format!("--method={}", self.name.name());
        [Some(method), rtol, dt, velocity, events].into_iter().flatten().collect()
    }

    fn solve(&self, problem: &Problem, detail: Detail<'_>) -> Result<Solution, IntegrationError> {
        if self.is_plain() {
            TAYLOR.integrator().solve(problem, detail)
        } else {
            self.build()?.integrator().solve(problem, detail)
        }
    }
}

/// A step: seconds, or a text such as `1 us`.
fn step(py: Python<'_>, given: &Bound<'_, PyAny>) -> PyResult<f64> {
    let help = "write a time such as \"1 us\", or seconds";
    match given.extract::<String>() {
        Ok(text) => penetrode::cli::method_args::time_option(&text, help)
            .map_err(|error| command_error(py, "OptionError", &error)),
        Err(_) => given.extract().map_err(|_| option_error(py, "dt is neither a number nor a text", help)),
    }
}

/// A place that the flight passes: the end of a stage, the exit, or rest.
///
/// Attributes
/// ----------
/// event : str
///     ``crater-end``, ``stage-end``, ``plug``, ``exit`` or ``rest``.
/// stage : int or None
///     Which stage ends.
/// time, depth, velocity : float
///     The state there [s, m, m/s].
#[pyclass(frozen, get_all, module = "penetrode")]
pub struct Event {
    event: &'static str,
    stage: Option<usize>,
    time: f64,
    depth: f64,
    velocity: f64,
}

#[pymethods]
impl Event {
    fn __repr__(&self) -> String {
        let Self { event, stage, time, depth, velocity } = self;
        let stage = stage.map_or_else(String::new, |stage| format!(" {stage}"));
        format!("<{event}{stage}: t = {time} s, x = {depth} m, V = {velocity} m/s>")
    }
}

/// A scene solved: how the flight ends, and its state anywhere.
///
/// Attributes
/// ----------
/// outcome : str
///     ``stopped-in-crater``, ``stopped-in-tunnel``, ``stopped``, ``perforated`` or ``undecided``.
/// depth, time, velocity : float
///     The end: rest depth X [m], time [s] and 0; of a perforation exit depth, time of exit and residual velocity V_r [m/s].
/// stage : int
///     Index from 0 of the stage where it ended.
/// exit_margin, exit_margin_error : float or None
///     W(exit)/V0^2, below zero for a stop, and the half-width of its error bar (docs/theory.md, section 6).
/// events : list of Event
///     In time order.
/// method : str
///     Name of the method.
#[pyclass(frozen, module = "penetrode")]
pub struct Flight {
    scene: Scene,
    chosen: Chosen,
    solution: Solution,
}

/// Solves a scene.
///
/// Parameters
/// ----------
/// scene : Scene
///     With an impact velocity.
/// method : str, default "taylor"
///     ``taylor``, ``tsit45``, ``bdf``, ``esdirk34``, ``tr-bdf2``, ``adaptive``, ``energy``, ``central-difference`` or
///     ``closed-form``.
/// rtol : float, optional
///     Relative tolerance, 1e-15 to 0.1, of methods that have one.
/// dt : float or str, optional
///     Time step [s] of central-difference, or a text such as "1 us".
/// velocity : {"lagged", "centred", "predicted"}, optional
///     V in the drag of central-difference.
/// events : {"step-end", "interpolated", "landed"}, optional
///     Where central-difference sees ends of stages, exit and rest.
///
/// Returns
/// -------
/// Flight
///
/// Raises
/// ------
/// OptionError
///     An option that the method does not use, or out of range.
/// RunError
///     The flight has no end, or none can be computed.
///
/// Examples
/// --------
/// >>> import penetrode as pn
/// >>> flight = pn.solve(pn.scene("tunnel"))
/// >>> flight.outcome, round(flight.depth, 6)
/// ('stopped-in-tunnel', 0.144826)
#[pyfunction]
#[pyo3(signature = (scene, method="taylor", *, rtol=None, dt=None, velocity=None, events=None))]
pub fn solve(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    method: &str,
    rtol: Option<f64>,
    dt: Option<&Bound<'_, PyAny>>,
    velocity: Option<&str>,
    events: Option<&str>,
) -> PyResult<Flight> {
    let chosen = Chosen::new(py, method, rtol, dt, velocity, events)?;
    let scene = scene.get().clone();
    let problem = scene.problem(py)?;
    let solution = if chosen.is_plain() {
        py.detach(|| TAYLOR.integrator().solve(problem, Detail::Events))
    } else {
        let (scene, chosen) = (scene.clone(), chosen.clone());
        interruptible(py, move || match scene.inner.problem() {
            Ok(problem) => chosen.solve(problem, Detail::Events),
            Err(_) => unreachable!("it resolved above"),
        })?
    };
    let solution = solution.map_err(|error| advised(py, "OptionError", &error))?;
    Ok(Flight { scene, chosen, solution })
}

/// Several arrays of numpy.
fn arrays<'py, const N: usize>(py: Python<'py>, columns: [Vec<f64>; N]) -> PyResult<Bound<'py, PyTuple>> {
    PyTuple::new(py, columns.map(|column| PyArray1::from_vec(py, column)))
}

/// `given` as numbers of numpy: one dimension, of 64 bits, side by side.
fn numbers<'py>(py: Python<'py>, given: &Bound<'py, PyAny>, what: &str) -> PyResult<PyReadonlyArray1<'py, f64>> {
    let refuse = |error: PyErr| {
        let message = format!("{what}: {}", error.value(py));
        option_error(py, &message, "give numbers in one row: a list or a one-dimensional array")
    };
    let keywords = PyDict::new(py);
    keywords.set_item("dtype", "float64")?;
    keywords.set_item("requirements", ["C", "A"])?;
    let numpy = py.import("numpy")?;
    // Neither truth nor texts nor complex numbers are taken for numbers.
    let kind: String =
        numpy.call_method1("asarray", (given,)).map_err(refuse)?.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        return Err(option_error(py, &format!("{what} are no real numbers"), "give a list or an array of numbers"));
    }
    let array = numpy.call_method("require", (given,), Some(&keywords)).map_err(refuse)?;
    let array = numpy.call_method1("atleast_1d", (array,))?;
    array.extract::<PyReadonlyArray1<'py, f64>>().map_err(|_| {
        let shape = array.getattr("shape").map_or_else(|_| String::new(), |shape| format!(" of the shape {shape}"));
        option_error(py, &format!("{what} are an array{shape}"), "give numbers in one row")
    })
}

impl Flight {
    /// The flight anew, with `detail`; its problem and its method are sound.
    fn again(&self, py: Python<'_>, detail: Detail<'_>) -> PyResult<Solution> {
        let problem = self.scene.problem(py)?;
        py.detach(|| self.chosen.solve(problem, detail)).map_err(|error| advised(py, "OptionError", &error))
    }

    /// The same flight, with states evenly in time from impact to the end.
    fn evenly(&self, py: Python<'_>, count: usize) -> PyResult<Solution> {
        let end = self.solution.end.time;
        // As the command has them.
        let times: Vec<f64> = (0..count).map(|i| end * (i as f64 / (count - 1) as f64)).collect();
        self.again(py, Detail::Times(&times))
    }

    /// What the command answers of it.
    fn answer(&self, py: Python<'_>) -> PyResult<Answer> {
        let words = ["solve".to_owned()].into_iter().chain(self.chosen.words()).collect();
        answer(py, words, Some(&self.scene), Vec::new(), "OptionError")
    }
}

#[pymethods]
impl Flight {
    #[getter]
    fn outcome(&self) -> &'static str {
        self.solution.outcome.name()
    }

    #[getter]
    fn depth(&self) -> f64 {
        self.solution.end.depth
    }

    #[getter]
    fn time(&self) -> f64 {
        self.solution.end.time
    }

    #[getter]
    fn velocity(&self) -> f64 {
        self.solution.end.velocity
    }

    #[getter]
    fn stage(&self) -> usize {
        self.solution.stage
    }

    #[getter]
    fn exit_margin(&self) -> Option<f64> {
        self.solution.exit_margin
    }

    #[getter]
    fn exit_margin_error(&self) -> Option<f64> {
        self.solution.exit_margin_error
    }

    #[getter]
    fn method(&self) -> &'static str {
        self.chosen.name.name()
    }

    /// The scene that was solved.
    #[getter]
    fn scene(&self) -> Scene {
        self.scene.clone()
    }

    #[getter]
    fn events(&self) -> Vec<Event> {
        let event = |event: &penetrode::physics::Event| Event {
            event: event.kind.name(),
            stage: match event.kind {
                penetrode::physics::EventKind::StageEnd(stage) => Some(stage),
                _ => None,
            },
            time: event.state.time,
            depth: event.state.depth,
            velocity: event.state.velocity,
        };
        self.solution.events.iter().map(event).collect()
    }

    /// Work done: accepted and rejected steps, evaluations of the force.
    #[getter]
    fn cost<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let cost = PyDict::new(py);
        cost.set_item("steps", self.solution.cost.steps)?;
        cost.set_item("rejected_steps", self.solution.cost.rejected_steps)?;
        cost.set_item("force_evaluations", self.solution.cost.force_evaluations)?;
        Ok(cost)
    }

    /// Depth and velocity at any times, by the method's own solution inside its steps.
    ///
    /// Parameters
    /// ----------
    /// times : array_like of float, shape (n,)
    ///     Times [s], in any order.
    ///
    /// Returns
    /// -------
    /// depth, velocity : numpy.ndarray of float, shape (n,)
    ///     [m], [m/s]; NaN before impact and behind the end of the flight.
    ///
    /// Raises
    /// ------
    /// OptionError
    ///     `times` are not numbers in one row.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> depth, velocity = pn.solve(pn.scene("tunnel")).at([0.0, 1e-4])
    /// >>> float(velocity[0])
    /// 300.0
    fn at<'py>(&self, py: Python<'py>, times: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
        let given = numbers(py, times, "the times")?;
        let given = given.as_slice().map_err(|error| option_error(py, &error.to_string(), ""))?;
        let mut order: Vec<usize> =
            (0..given.len()).filter(|&i| given[i] >= 0.0 && given[i] <= self.solution.end.time).collect();
        order.sort_by(|&a, &b| given[a].total_cmp(&given[b]));
        let wanted: Vec<f64> = order.iter().map(|&i| given[i]).collect();
        let [mut depth, mut velocity] = [(); 2].map(|()| vec![f64::NAN; given.len()]);
        if !wanted.is_empty() {
            let flight = self.again(py, Detail::Times(&wanted))?;
            for (&index, Sample { state, .. }) in order.iter().zip(&flight.trajectory) {
                (depth[index], velocity[index]) = (state.depth, state.velocity);
            }
        }
        arrays(py, [depth, velocity])
    }

    /// Time and velocity at any depths: there the same flight leaves a target that ends there.
    ///
    /// Parameters
    /// ----------
    /// depths : array_like of float, shape (n,)
    ///     Depths [m] from the impact face, in any order.
    ///
    /// Returns
    /// -------
    /// time, velocity : numpy.ndarray of float, shape (n,)
    ///     [s], [m/s]; NaN in front of the face and where the flight does not come.
    ///
    /// Raises
    /// ------
    /// OptionError
    ///     `depths` are not numbers in one row.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> flight = pn.solve(pn.scene("tunnel"))
    /// >>> time, velocity = flight.at_depth([0.05, 1.0])
    /// >>> bool(velocity[0] > 200), bool(velocity[1] > 0)
    /// (True, False)
    fn at_depth<'py>(&self, py: Python<'py>, depths: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
        let given = numbers(py, depths, "the depths")?;
        let given = given.as_slice().map_err(|error| option_error(py, &error.to_string(), ""))?;
        let problem = self.scene.problem(py)?.clone();
        let end = self.solution.end;
        let (speed, chosen) = (problem.impact_speed, self.chosen.clone());
        let states = py.detach(|| {
            let state = |&depth: &f64| match depth {
                0.0 => Ok([0.0, speed]),
                _ if depth == end.depth => Ok([end.time, end.velocity]),
                _ if !(depth > 0.0 && depth < end.depth) => Ok([f64::NAN; 2]),
                _ => {
                    let left = chosen.solve(&problem.clone().with_exit(depth), Detail::End)?;
                    Ok([left.end.time, left.end.velocity])
                }
            };
            given.iter().map(state).collect::<Result<Vec<_>, IntegrationError>>()
        });
        let states = states.map_err(|error| advised(py, "OptionError", &error))?;
        arrays(py, [0, 1].map(|i| states.iter().map(|state| state[i]).collect()))
    }

    /// States evenly in time, from impact to the end.
    ///
    /// Parameters
    /// ----------
    /// n : int, default 200
    ///     How many, from 2 to 10 million.
    ///
    /// Returns
    /// -------
    /// dict of numpy.ndarray, each of shape (n,)
    ///     ``time`` [s], ``depth`` [m], ``velocity`` [m/s], ``force`` [N].
    ///
    /// Raises
    /// ------
    /// OptionError
    ///     `n` is out of range.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> pn.solve(pn.scene("tunnel")).trajectory(3)["velocity"][-1].item()
    /// 0.0
    #[pyo3(signature = (n=200))]
    fn trajectory<'py>(&self, py: Python<'py>, n: i64) -> PyResult<Bound<'py, PyDict>> {
        let count = usize::try_from(n).ok().filter(|n| (2..=10_000_000).contains(n));
        let count = count.ok_or_else(|| option_error(py, &format!("n = {n} is not allowed"), "from 2 to 10000000"))?;
        let flight = self.evenly(py, count)?;
        let all = PyDict::new(py);
        let columns: [(&str, fn(&Sample) -> f64); 4] = [
            ("time", |s| s.state.time),
            ("depth", |s| s.state.depth),
            ("velocity", |s| s.state.velocity),
            ("force", |s| s.force),
        ];
        for (name, number) in columns {
            all.set_item(name, PyArray1::from_iter(py, flight.trajectory.iter().map(number)))?;
        }
        Ok(all)
    }

    /// What ``penetrode solve --json`` prints of it: scene, groups, events, cost, the closed form beside it and its errors.
    ///
    /// Returns
    /// -------
    /// dict
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.answer(py)?.dict(py)
    }

    /// Draws depth and velocity over time.
    ///
    /// Parameters
    /// ----------
    /// axes : sequence of two matplotlib axes, optional
    ///     Where to draw; new ones without it.
    ///
    /// Returns
    /// -------
    /// sequence of two matplotlib axes
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     matplotlib is not installed.
    #[pyo3(signature = (axes=None))]
    fn plot<'py>(slf: &Bound<'py, Self>, axes: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("penetrode._plot")?.call_method1("flight", (slf, axes))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.answer(py)?.text().trim_end().to_owned())
    }

    /// The figure of the report, for a notebook.
    fn _repr_html_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let figures: Vec<String> = of_flight(&self.evenly(py, DRAWN)?).iter().map(|figure| figure.file()).collect();
        py.import("penetrode._html")?.call_method1("page", (self.__repr__(py)?, figures))
    }
}
