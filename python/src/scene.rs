//! A scene: the text that describes it, what was set in it, and what they mean.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use penetrode::Problem;
use penetrode::cli::scene_json::SceneJson;
use penetrode::exchange::scene_file::{SHIPPED, SceneFile, text_at};
use penetrode::physics::ResolveError;
use penetrode::text::Shown;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple, PyType};

use crate::errors::{advised, option_error, scene_error};

/// Tables of a scene file; anything else at the top is a number of one of them.
const TABLES: [&str; 8] =
    ["title", "projectile", "target", "resistance", "impact", "perforation", "stage", "parameters"];

/// Keywords of a scene, by the tables where they stand in a file.
const KEYWORDS: [(&str, &str); 16] = [
    ("mass", "projectile.mass"),
    ("diameter", "projectile.diameter"),
    ("nose", "projectile.nose"),
    ("nose_factor", "projectile.nose.factor"),
    ("strength", "target.strength"),
    ("density", "target.density"),
    ("thickness", "target.thickness"),
    ("layer", "target.layer"),
    ("S", "resistance.S"),
    ("B", "resistance.B"),
    ("k", "resistance.k"),
    ("crater_stiffness", "resistance.crater_stiffness"),
    ("velocity", "impact.velocity"),
    ("criterion", "perforation.criterion"),
    ("half_angle", "perforation.half_angle"),
    ("shear_strength", "perforation.shear_strength"),
];

/// What a scene is made from, and what it means.
#[derive(Debug)]
pub struct Inner {
    /// Name of its file, or of the scene that ships.
    pub name: String,
    /// Its text.
    pub text: String,
    /// What is set in it.
    pub settings: Vec<String>,
    /// What they mean.
    pub scene: penetrode::Scene,
    problem: OnceLock<Result<Problem, ResolveError>>,
}

impl Inner {
    fn new(py: Python<'_>, name: String, text: String, settings: Vec<String>) -> PyResult<Scene> {
        let read = SceneFile::from_toml(&text, &name, &settings).map_err(|error| scene_error(py, &error))?;
        let inner = Self { name, text, settings, scene: read.scene, problem: OnceLock::new() };
        Ok(Scene { inner: Arc::new(inner) })
    }

    /// Its stages at its impact velocity.
    pub fn problem(&self) -> Result<&Problem, &ResolveError> {
        self.problem.get_or_init(|| self.scene.problem()).as_ref()
    }

    /// The words that name it on a command line, and the file that a command reads.
    pub fn words(&self) -> (Vec<String>, (String, Vec<u8>)) {
        let settings = self.settings.iter().flat_map(|setting| ["--set".to_owned(), setting.clone()]);
        let words = [self.name.clone()].into_iter().chain(settings).collect();
        (words, (self.name.clone(), self.text.clone().into_bytes()))
    }
}

/// A projectile, a target and the resistance between them.
///
/// Numbers are texts with a unit, ``"36 MPa"``, or SI numbers. The keywords are the keys of a scene file without their
/// tables; whole tables may be given too. A scene never changes: ``set`` makes another one.
///
/// Parameters
/// ----------
/// mass : str or float
///     Mass M [kg], above zero.
/// diameter : str or float
///     Diameter d [m], above zero.
/// nose_factor : float
///     Nose factor N*, 0 to 1; or ``nose={"shape": "ogive", "caliber_radius_head": 3}``.
/// strength, density : str or float
///     Compressive strength fc [Pa], above zero; density rho [kg/m^3], not negative.
/// thickness : str or float, optional
///     Thickness H [m]; a target without one has no far side.
/// S, B, k : float, optional
///     Static factor (default 72/sqrt(fc/MPa), Eq. 14), inertia factor (1), crater depth in diameters (2).
/// crater_stiffness : str or float, optional
///     Crater constant c [N/m]; by default the one that makes the force continuous.
/// velocity : str or float, optional
///     Impact velocity V0 [m/s].
/// criterion : {"full-depth", "ndrc", "plug"}, optional
///     When the target counts as perforated.
/// half_angle, shear_strength : str or float, optional
///     Of the plug [degrees], below 90; around it [Pa], above zero: required with ``plug``, refused without.
/// title, projectile, target, resistance, impact, perforation, stage, parameters : optional
///     The tables of a scene file; ``stage=[{"force": "P + b*V", ...}]`` and ``parameters`` are a law of your own.
///
/// Raises
/// ------
/// SceneError
///     Something is missing, unknown, of a wrong dimension or out of range; the message underlines it.
///
/// Notes
/// -----
/// Equation of motion and resistance: Li and Chen (2003), Ahmad Zaidi et al. (2009). The keys: docs/reference.md.
///
/// Examples
/// --------
/// >>> import penetrode as pn
/// >>> scene = pn.Scene(mass="2 kg", diameter="50 mm", nose_factor=0.72, strength="36 MPa",
/// ...                  density=2300.0, S=12.0, thickness="180 mm", velocity="400 m/s")
/// >>> scene.mass, scene.thickness, scene.velocity
/// (2.0, 0.18, 400.0)
#[pyclass(frozen, module = "penetrode", eq, from_py_object)]
#[derive(Clone)]
pub struct Scene {
    pub inner: Arc<Inner>,
}

impl PartialEq for Scene {
    fn eq(&self, other: &Self) -> bool {
        self.inner.scene == other.inner.scene
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (**keywords))]
    fn new(py: Python<'_>, keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let tables = PyDict::new(py);
        for (key, value) in keywords.into_iter().flat_map(|keywords| keywords.iter()) {
            let name: String = key.extract()?;
            let path = KEYWORDS.iter().find(|(known, _)| *known == name).map_or(name.as_str(), |(_, path)| path);
            if !value.is_none() {
                put(&tables, path, &value)?;
            }
        }
        Inner::new(py, "the keywords".to_owned(), toml_of(&tables)?, Vec::new())
    }

    /// The scene of a TOML text, or in the file at a path.
    ///
    /// Parameters
    /// ----------
    /// text_or_path : str or os.PathLike
    ///     A text with line breaks or `=` in it is the scene itself; anything else is the path of its file, or the name of a
    ///     scene that ships.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     The file cannot be read, or holds no scene; the message underlines the fault.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> text = '''
    /// ... projectile = { mass = "1 kg" }
    /// ... impact = { velocity = 100 }
    /// ... [[stage]]
    /// ... static_force = "2 kN"
    /// ... '''
    /// >>> pn.Scene.from_toml(text).mass
    /// 1.0
    #[classmethod]
    fn from_toml(_class: &Bound<'_, PyType>, py: Python<'_>, text_or_path: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(text) = text_or_path.extract::<String>()
            && text.contains(['\n', '='])
            && !Path::new(&text).is_file()
        {
            return Inner::new(py, "the text".to_owned(), text, Vec::new());
        }
        let path: PathBuf = text_or_path.extract()?;
        if path.as_os_str() == "-" {
            return Err(option_error(py, "`-` is standard input", "read it and give the text: sys.stdin.read()"));
        }
        let (name, text) = text_at(&path).map_err(|error| scene_error(py, &error))?;
        Inner::new(py, name, text, Vec::new())
    }

    /// The scene of nested tables, as a scene file has them.
    ///
    /// Parameters
    /// ----------
    /// tables : dict
    ///     Such as ``{"projectile": {"mass": "2 kg"}, "stage": [{"static_force": 1e6}]}``. A value of None is left out.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     They are no scene.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> pn.Scene.from_dict({"projectile": {"mass": 1.0}, "stage": [{"static_force": "2 kN"}],
    /// ...                     "impact": {"velocity": 100}}).velocity
    /// 100.0
    #[classmethod]
    fn from_dict(_class: &Bound<'_, PyType>, py: Python<'_>, tables: &Bound<'_, PyMapping>) -> PyResult<Self> {
        let copy = PyDict::new(py);
        for pair in tables.items()?.iter() {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair.extract()?;
            if !value.is_none() {
                copy.set_item(key, value)?;
            }
        }
        Inner::new(py, "the tables".to_owned(), toml_of(&copy)?, Vec::new())
    }

    /// The same scene from its parts: how it is unpickled.
    #[classmethod]
    fn _restored(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        name: String,
        text: String,
        settings: Vec<String>,
    ) -> PyResult<Self> {
        Inner::new(py, name, text, settings)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, String, Vec<String>))> {
        let inner = &slf.get().inner;
        let parts = (inner.name.clone(), inner.text.clone(), inner.settings.clone());
        Ok((slf.get_type().getattr("_restored")?, parts))
    }

    /// The scene with other numbers.
    ///
    /// Parameters
    /// ----------
    /// settings : dict, optional
    ///     By path: ``{"impact.velocity": "400 m/s", "stage.0.end": 0.1}``.
    /// **keywords
    ///     By the keywords of `Scene`: ``velocity=400``.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     A path or a value that the scene cannot have.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> pn.scene("tunnel").set(velocity="350 m/s", k=1.5).velocity
    /// 350.0
    #[pyo3(signature = (settings=None, **keywords))]
    fn set(
        &self,
        py: Python<'_>,
        settings: Option<&Bound<'_, PyDict>>,
        keywords: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let inner = &self.inner;
        let mut all = inner.settings.clone();
        for (key, value) in [settings, keywords].into_iter().flatten().flat_map(|given| given.iter()) {
            let name: String = key.extract()?;
            let path = KEYWORDS.iter().find(|(known, _)| *known == name).map_or(name.as_str(), |(_, path)| path);
            let value = match value.extract::<String>() {
                Ok(text) => text,
                Err(_) => literal(&value, path)?,
            };
            all.push(format!("{path}={value}"));
        }
        Inner::new(py, inner.name.clone(), inner.text.clone(), all)
    }

    /// Title, or None.
    #[getter]
    fn title(&self) -> Option<&str> {
        self.inner.scene.title.as_deref()
    }

    /// Name of its file, or of the scene that ships.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Its text, as a scene file has it; what was set since stands apart.
    #[getter]
    fn text(&self) -> &str {
        &self.inner.text
    }

    /// Mass M [kg].
    #[getter]
    fn mass(&self) -> f64 {
        self.inner.scene.mass
    }

    /// Impact velocity V0 [m/s], or None.
    #[getter]
    fn velocity(&self) -> Option<f64> {
        self.inner.scene.velocity
    }

    /// Thickness H [m], or None for a target without a far side.
    #[getter]
    fn thickness(&self) -> Option<f64> {
        self.inner.scene.thickness
    }

    /// Its numbers and stages in SI units, by the names of the command's JSON.
    ///
    /// Returns
    /// -------
    /// dict
    ///     As `scene` of ``penetrode solve --json``. A scene without an impact velocity has none at 0.
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     Its numbers give no stages.
    ///
    /// Examples
    /// --------
    /// >>> import penetrode as pn
    /// >>> pn.scene("tunnel").to_dict()["diameter_m"]
    /// 0.05
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scene = &self.inner.scene;
        let problem = match scene.velocity {
            Some(_) => self.problem(py)?.clone(),
            None => scene.resolve(0.0).map_err(|error| advised(py, "SceneError", &error))?,
        };
        let json = serde_json::to_string(&SceneJson::new(scene, &problem)).unwrap_or_default();
        let dict = loads(py, &json)?;
        if scene.velocity.is_none() {
            dict.set_item("velocity_m_s", py.None())?;
        }
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let scene = &self.inner.scene;
        let mut text = format!("<penetrode.Scene {:?}: M = {} kg", self.label(), Shown(scene.mass));
        for (symbol, value, unit) in [("V0", scene.velocity, "m/s"), ("H", scene.thickness, "m")] {
            if let Some(value) = value {
                let _ = write!(text, ", {symbol} = {} {unit}", Shown(value));
            }
        }
        text + ">"
    }
}

impl Scene {
    /// Title, or else the name.
    fn label(&self) -> &str {
        self.inner.scene.title.as_deref().unwrap_or(&self.inner.name)
    }

    /// Its stages at its impact velocity.
    pub fn problem(&self, py: Python<'_>) -> PyResult<&Problem> {
        self.inner.problem().map_err(|error| advised(py, "SceneError", error))
    }
}

/// Names of the scenes that ship.
///
/// Returns
/// -------
/// list of str
///
/// Examples
/// --------
/// >>> import penetrode as pn
/// >>> "tunnel" in pn.scene_names()
/// True
#[pyfunction]
pub fn scene_names() -> Vec<&'static str> {
    SHIPPED.iter().map(|(name, _)| *name).collect()
}

/// What a JSON text says, as Python has it.
pub fn loads<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import(pyo3::intern!(py, "json"))?.call_method1(pyo3::intern!(py, "loads"), (json,))
}

/// Puts `value` at the dotted `path` of nested tables.
fn put(tables: &Bound<'_, PyDict>, path: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let Some((first, rest)) = path.split_once('.') else { return tables.set_item(path, value) };
    let inner = match tables.get_item(first)? {
        Some(table) => table.cast_into::<PyDict>()?,
        None => PyDict::new(tables.py()),
    };
    put(&inner, rest, value)?;
    tables.set_item(first, inner)
}

/// The text of a scene file with these tables, one line a number.
fn toml_of(tables: &Bound<'_, PyDict>) -> PyResult<String> {
    let (mut words, mut text) = (String::new(), String::new());
    for (key, value) in tables.iter() {
        let name: String = key.extract().map_err(|_| unfit(&key, "a key"))?;
        let shown = self::key(&name);
        let entries =
            value.cast::<PyList>().ok().filter(|list| list.iter().all(|entry| entry.is_instance_of::<PyDict>()));
        if let Ok(table) = value.cast::<PyDict>()
            && TABLES.contains(&name.as_str())
        {
            let _ = write!(text, "[{shown}]\n{}", lines(table)?);
        } else if let Some(entries) = entries.filter(|entries| !entries.is_empty()) {
            for entry in entries.iter() {
                let _ = write!(text, "[[{shown}]]\n{}", lines(entry.cast::<PyDict>()?)?);
            }
        } else {
            let _ = writeln!(words, "{shown} = {}", literal(&value, &name)?);
        }
    }
    Ok(words + &text)
}

/// The entries of a table, one line each.
fn lines(table: &Bound<'_, PyDict>) -> PyResult<String> {
    let mut text = String::new();
    for (name, value) in entries(table)? {
        let _ = writeln!(text, "{} = {}", key(&name), literal(&value, &name)?);
    }
    Ok(text)
}

/// The entries of a table that hold something.
fn entries<'py>(table: &Bound<'py, PyDict>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let named = |(key, value): (Bound<'py, PyAny>, _)| Ok((key.extract().map_err(|_| unfit(&key, "a key"))?, value));
    table.iter().filter(|(_, value)| !value.is_none()).map(named).collect()
}

/// A key as TOML writes it.
fn key(name: &str) -> String {
    let is_bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if is_bare { name.to_owned() } else { quoted(name) }
}

/// A text as TOML writes it: the escapes of JSON are among those of TOML.
fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default().replace('\u{7f}', "\\u007f")
}

fn unfit(value: &Bound<'_, PyAny>, what: &str) -> PyErr {
    let kind = value.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
    let message = format!("{what} of a scene is of the type {kind}");
    option_error(value.py(), &message, "give a number, a text with a unit, or a dict of them")
}

/// A value as TOML writes it; `name` is its key.
fn literal(value: &Bound<'_, PyAny>, name: &str) -> PyResult<String> {
    // Truth is an integer to Python.
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(truth.is_true().to_string());
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(quoted(text.to_str()?));
    }
    if let Ok(table) = value.cast::<PyDict>() {
        let parts = entries(table)?
            .into_iter()
            .map(|(name, value)| Ok(format!("{} = {}", key(&name), literal(&value, &name)?)));
        return Ok(format!("{{ {} }}", parts.collect::<PyResult<Vec<_>>>()?.join(", ")));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let parts = value.try_iter()?.map(|part| literal(&part?, name));
        return Ok(format!("[{}]", parts.collect::<PyResult<Vec<_>>>()?.join(", ")));
    }
    let is_number = value.is_instance_of::<PyInt>() || value.is_instance_of::<PyFloat>();
    // Scalars of numpy are numbers too; an array of one number is not.
    let is_scalar = || value.getattr("shape").is_ok_and(|shape| shape.len().is_ok_and(|length| length == 0));
    if is_number || is_scalar() {
        let number: f64 = value.extract().map_err(|_| unfit(value, &format!("`{name}`")))?;
        return Ok(if number.is_nan() { "nan".to_owned() } else { format!("{number:?}") });
    }
    Err(unfit(value, &format!("`{name}`")))
}
