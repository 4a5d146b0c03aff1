"""Studies: what the commands answer, as objects."""

from __future__ import annotations

import csv
import io
import math
import os
import random
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _html, _penetrode
from ._errors import OptionError, RunError, TableError
from ._penetrode import Problem, Scene
from ._solvers import Solver

#: A path.
PathLike = str | os.PathLike[str]


class Answer:
    """What a command answered: its JSON by attributes, ``answer.verdict``, and its text for a terminal.

    Attributes
    ----------
    exit : int
        The exit code of the command: 0 all is well, 3 a criterion failed, 4 undecided.
    notes : list of str
        Warnings and notes; warnings are given to `warnings` too.
    """

    exit: int
    notes: list[str]
    _data: dict[str, Any]
    _text: str
    _again: Callable[[Path], Iterator[Path]] | None
    _figures: list[str] | None

    def __init__(
        self,
        parts: tuple[Any, str, int, list[str]],
        again: Callable[[Path], Iterator[Path]] | None = None,
        figures: list[str] | None = None,
    ) -> None:
        self._data, self._text, self.exit, self.notes = parts
        self._again, self._figures = again, figures
        for note in self.notes:
            if note.startswith("warning: "):
                warnings.warn(note.removeprefix("warning: "), stacklevel=3)

    def __getattr__(self, name: str) -> Any:
        # Before there is data, as while it is unpickled, there is no attribute.
        data = self.__dict__.get("_data", {})
        if name in data:
            return data[name]
        raise AttributeError(f"{name!r}; there are {', '.join(data)}")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._data})

    def to_dict(self) -> dict[str, Any]:
        """What ``--json`` of the command prints."""
        return self._data

    def __repr__(self) -> str:
        return self._text.rstrip()

    def figures(self) -> list[str]:
        """The figures of the command's report, as SVG.

        Returns
        -------
        list of str
            May be empty. The study is run once more for them, where it is one of milliseconds.
        """
        if self._figures is None:
            self._figures = []
            if self._again is not None:
                with tempfile.TemporaryDirectory(prefix="penetrode-") as folder, warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    self._figures = [path.read_text("utf-8") for path in self._again(Path(folder))]
        return self._figures

    def _repr_html_(self) -> str:
        return _html.page(self._text, self.figures())

    def plot(self, ax: Any = None) -> Any:
        """Draw the numbers on matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Where to draw; new ones without it.

        Returns
        -------
        matplotlib axes

        Raises
        ------
        ImportError
            matplotlib is not installed.
        OptionError
            The answer is no study that is drawn.
        """
        from . import _plot

        drawings = {"quantities": _plot.errors, "rows": _plot.swept, "lines": _plot.lines}
        for name, draw in drawings.items():
            if name in self._data:
                return draw(self, ax)
        raise OptionError("there is nothing to draw", "take its numbers: to_dict()")


class Critical(Answer):
    """The critical velocity of a scene, beside the closed form and Eq. 15.

    Attributes
    ----------
    velocity : float or None
        V_c [m/s], the least that perforates; None where several intervals of velocity do, ``perforating_velocities_m_s``.
    error : float or None
        Half-width of its error bar [m/s].
    energy : float or None
        E_c = M V_c^2/2 [J].
    """

    def _number(self, name: str) -> float | None:
        found = self._data[name]
        return None if found is None else float(found)

    @property
    def velocity(self) -> float | None:
        """V_c [m/s]."""
        return self._number("critical_velocity_m_s")

    @property
    def error(self) -> float | None:
        """Half-width of the error bar of V_c [m/s]."""
        return self._number("error_bar_m_s")

    @property
    def energy(self) -> float | None:
        """E_c [J]."""
        return self._number("critical_energy_j")


def scene(name: PathLike, settings: dict[str, Any] | None = None, **keywords: Any) -> Scene:
    """The scene that ships under a name, or in a file, with other numbers where they are given.

    Parameters
    ----------
    name : str or os.PathLike
        One of `scene_names`, or the path of a scene file.
    settings : dict, optional
        What is set in it, by path; as `Scene.set`.
    **keywords
        The same by the keywords of `Scene`.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        There is none, or it cannot have such numbers.

    Examples
    --------
    >>> import penetrode as pn
    >>> pn.scene("tunnel", thickness="150 mm").thickness
    0.15
    """
    found = Scene.from_toml(os.fspath(name))
    return found.set(settings, **keywords) if settings or keywords else found


def _word(value: object) -> str:
    """A value as it is typed."""
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, int):
        return str(value)
    try:
        return repr(float(value))  # type: ignore[arg-type]
    except (TypeError, ValueError):
        kind = type(value).__name__
        raise OptionError(f"an option is of the type {kind}", "give a number, a text or a path") from None


def _words(options: Mapping[str, object]) -> list[str]:
    """Options as they are typed; None is left out, True a word alone, a list several."""
    words: list[str] = []
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, Mapping):
            words.extend(f"{option}={key}={_word(part)}" for key, part in value.items())
        elif isinstance(value, (list, tuple)):
            words.extend(f"{option}={_word(part)}" for part in value)
        else:
            words.append(f"{option}={_word(value)}")
    return words


def _colons(value: object) -> object:
    """A range as the command takes it: numbers with colons between them."""
    return ":".join(_word(part) for part in value) if isinstance(value, (list, tuple)) else value


def _ask(
    words: list[str], scene: Scene | None = None, files: Sequence[tuple[str, bytes]] = (), fault: str = "OptionError"
) -> tuple[Any, str, int, list[str]]:
    return _penetrode.call(words, scene, list(files), fault)


def _scene(given: Scene | PathLike) -> Scene:
    if isinstance(given, Scene):
        return given
    if isinstance(given, (str, os.PathLike)):
        return scene(given)
    kind = type(given).__name__
    raise OptionError(f"a {kind} is no scene", "give a Scene, or the name of one that ships")


def _of_report(words: list[str], **given: Any) -> Callable[[Path], Iterator[Path]]:
    """The figures of the report that a command writes."""

    def again(folder: Path) -> Iterator[Path]:
        _ask([*words, f"--out={folder / 'report'}"], **given)
        return iter(sorted((folder / "report" / "figures").glob("*.svg")))

    return again


def _of_table(words: list[str], **given: Any) -> Callable[[Path], Iterator[Path]]:
    """The figures that a command writes beside its table."""

    def again(folder: Path) -> Iterator[Path]:
        _ask([*words, f"--out={folder / 'table.csv'}"], **given)
        return iter(sorted(folder.glob("*.svg")))

    return again


def critical(scene: Scene | PathLike, method: str = "taylor", **options: Any) -> Critical:
    """The critical velocity: the least that perforates.

    Parameters
    ----------
    scene : Scene or str
        With a thickness, or the name of one.
    method : str
        As in `solve`.
    **options
        Those of the command: `rtol`, `dt`, `velocity`, `events` of the method; ``spread={"target.strength": "5%"}``, `samples`
        and `seed` for its uncertainty.

    Returns
    -------
    Critical
        With ``velocity`` [m/s], ``error`` [m/s], ``energy`` [J].

    Raises
    ------
    OptionError
        An option that is none, or a scene without a thickness.
    RunError
        No finite velocity perforates, or it cannot be decided which.

    Notes
    -----
    Eq. 15: Li and Chen (2003); as E_c/(d^3 fc) in ``eq15``.

    Examples
    --------
    >>> import penetrode as pn
    >>> round(pn.critical("paper-slab").velocity, 6)
    177.949686
    """
    return Critical(_ask(["critical", *_words({"method": method, **options})], _scene(scene)))


def converge(
    scene: Scene | PathLike | Callable[[Problem], Any],
    method: str | None = None,
    *,
    on: Scene | PathLike | None = None,
    dt: str | tuple[float | str, float | str] | None = None,
    points: int | None = None,
    seed: int = 1,
    order: float | Mapping[str, float] | None = None,
    **options: Any,
) -> Answer:
    """The order of convergence of every quantity: of a method on a scene, or of a scheme of your own.

    Parameters
    ----------
    scene : Scene, str or callable
        The scene, or the scheme: of a `Problem` with a step `dt`, to depth [m], time [s] and velocity [m/s] at the end of the
        flight.
    method : str, default "central-difference"
        As in `solve`; with the rules `velocity` and `events` of central-difference.
    on : Scene or str
        The scene that a scheme of your own is tried on.
    dt : str or pair, optional
        Smallest and largest step, ``("10ns", "10us")`` or ``(1e-8, 1e-5)`` [s]; by default from the time of flight.
    points : int, optional
        How many steps or tolerances.
    seed : int, default 1
        Of the random ratios between them.
    order : float or dict, optional
        The order that your scheme claims, of all quantities or of each.

    Returns
    -------
    Answer
        With ``verdict`` and ``quantities``: ``observed_order``, its ``interval``, ``class``, ``points``.

    Raises
    ------
    OptionError, SceneError, RunError
        As the command; RunError also where your scheme gives no numbers.

    Examples
    --------
    >>> import penetrode as pn
    >>> found = pn.converge("tunnel", velocity="centred", events="interpolated", points=12)
    >>> round(next(q["observed_order"] for q in found.quantities if q["quantity"] == "depth"), 1)
    2.0
    """
    if not callable(scene):
        if on is not None or order is not None:
            raise OptionError("`on` and `order` belong to a scheme of your own", "leave them out")
        given = {"method": method, "dt": _colons(dt), "points": points, "seed": seed, **options}
        words = ["converge", *_words(given)]
        of: dict[str, Any] = {"scene": _scene(scene)}
        return Answer(_ask(words, **of), _of_report(words, **of))
    if on is None:
        raise OptionError("there is no scene to try the scheme on", 'name one: on="tunnel"')
    if method is not None or options:
        raise OptionError("a scheme of your own takes no method", "leave it out")
    return audit(_ladder(scene, _scene(on), dt, 16 if points is None else points, seed), scene=on, order=order)


def _ladder(
    scheme: Callable[[Problem], Any], scene: Scene, dt: Any, points: int, seed: int
) -> dict[str, list[float]]:
    """Results of `scheme` on `scene` at steps that are log-uniform with random ratios."""
    flight = _penetrode.solve(scene)
    if dt is None:
        least, most = 1e-4 * flight.time, 1e-2 * flight.time
    else:
        least, most = (float(step) for step in (dt.split(":") if isinstance(dt, str) else dt))
    if not 0 < least < most < math.inf or points < 3:
        raise OptionError(f"dt = {dt}, points = {points} are no ladder", "give two steps above zero and 3 points or more")
    chance = random.Random(seed)
    steps = [
        least * (most / least) ** ((i + (chance.random() if 0 < i < points - 1 else i / (points - 1))) / points)
        for i in range(points)
    ]
    perforates = flight.outcome == "perforated"
    names = ["time_s", "velocity_m_s"] if perforates else ["depth_m", "time_s"]
    table: dict[str, list[float]] = {"dt_s": steps, **{name: [] for name in names}}
    for step in steps:
        answer = scheme(Problem.of(scene, dt=step))
        try:
            if isinstance(answer, Mapping):
                end = {name: float(answer[name]) for name in names}
            else:
                end = dict(zip(("depth_m", "time_s", "velocity_m_s"), (float(part) for part in answer), strict=True))
        except (TypeError, ValueError, KeyError) as error:
            message = f"the scheme gives no depth, time and velocity at dt = {step} s: {answer!r:.60}"
            raise RunError(message, "return the three numbers at the end of the flight") from error
        for name in names:
            table[name].append(end[name])
    return table


def _csv(table: Any) -> bytes:
    """A table of columns as CSV, every number in the digits that read back to it."""
    import numpy as np

    names = list(table.columns) if hasattr(table, "columns") else list(table)
    columns = []
    for name in names:
        column = np.asarray(table[name])
        if column.ndim != 1 or column.dtype.kind not in "fiu":
            what = f"of {column.ndim} dimensions" if column.ndim != 1 else f"of the type {column.dtype}"
            raise TableError(f"the column `{name}` is {what}", "give one number a row")
        columns.append([repr(value) for value in column.tolist()])
    if len({len(column) for column in columns}) > 1:
        raise TableError("the columns differ in length", "give one row a step")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(zip(*columns))
    return text.getvalue().encode()


def audit(
    table: PathLike | Mapping[str, Any] | Any,
    scene: Scene | PathLike | None = None,
    order: float | Mapping[str, float] | None = None,
    **options: Any,
) -> Answer:
    """Order, error bar and verdict for results that another code gave at several steps.

    Parameters
    ----------
    table : path, dict of arrays or DataFrame
        ``dt_s`` and any of ``depth_m, time_s, velocity_m_s, crater_end_time_s, crater_end_velocity_m_s,
        critical_velocity_m_s`` in these or other units (``dt_us``), and other columns of numbers; one row a step.
    scene : Scene or str, optional
        Whose exact answer the results must approach.
    order : float or dict, optional
        The formal order: 2, or ``{"depth": 2, "time": 1}``.
    **options
        Those of the command.

    Returns
    -------
    Answer
        With ``verdict``, ``findings``, ``quantities``: ``finest``, ``error_band``, ``observed_order``.

    Raises
    ------
    TableError
        A table that cannot be judged: too few steps, one step with two values, a name that is none.

    Examples
    --------
    >>> import penetrode as pn
    >>> steps = [1e-5, 1.7e-5, 3e-5, 5e-5]
    >>> found = pn.audit({"dt_s": steps, "depth_m": [0.1 + 40.0 * dt * dt * 1e5 for dt in steps]})
    >>> found.verdict, round(found.quantities[0]["observed_order"], 3)
    ('passed', 2.0)
    """
    files: list[tuple[str, bytes]] = []
    if isinstance(table, (str, os.PathLike)):
        name = os.fspath(table)
    elif hasattr(table, "__getitem__") and (hasattr(table, "columns") or isinstance(table, Mapping)):
        name = "table"
        files.append((name, _csv(table)))
    else:
        raise TableError(f"a {type(table).__name__} is no table", "give a dict of arrays, a DataFrame or a path")
    if isinstance(order, Mapping):
        orders: object = ",".join(f"{key}={_word(value)}" for key, value in order.items())
    else:
        orders = order
    words = ["audit", name, *_words({"order": orders, **options})]
    if scene is not None:
        given = _scene(scene)
        name, text, settings = given.__reduce__()[1]
        files.append((name, text.encode()))
        words += [f"--scene={name}", *(f"--set={setting}" for setting in settings)]
    of: dict[str, Any] = {"files": files, "fault": "TableError"}
    return Answer(_ask(words, **of), _of_report(words, **of))


#: Options of `sweep`; any other keyword is a number to vary.
_OF_SWEEP = ("method", "rtol", "dt", "velocity", "events", "data", "out")


def sweep(scene: Scene | PathLike, vary: Mapping[str, Any] | None = None, **keywords: Any) -> Answer:
    """V_c, E_c/(d^3 fc), Eq. 15 and their difference along one number of a scene, or over two.

    Parameters
    ----------
    scene : Scene or str
    vary : dict, optional
        What is varied: ``{"H/d": (0.5, 18, 200)}``, from, to and how many values; a fourth part ``"log"``.
    **keywords
        The same, ``**{"H/d": (0.5, 18, 200)}``; and the options of the command, `method` and its options, `data`, `out`.

    Returns
    -------
    Answer
        With ``rows``, the last number running fastest: ``values``, ``critical_velocity_m_s``, ``dimensionless_energy``,
        ``eq15_printed``.

    Raises
    ------
    OptionError
        A path that the scene does not have, or a range that is none.

    Examples
    --------
    >>> import penetrode as pn
    >>> found = pn.sweep("paper-slab", {"H/d": (1, 5, 3)})
    >>> [row["values"] for row in found.rows]
    [[1.0], [3.0], [5.0]]
    """
    options = {name: value for name, value in keywords.items() if name in _OF_SWEEP}
    axes = {**(vary or {}), **{name: value for name, value in keywords.items() if name not in _OF_SWEEP}}
    words = ["sweep", *(f"--vary={path}={_colons(value)}" for path, value in axes.items())]
    out = options.pop("out", None)
    words += _words(options)
    of: dict[str, Any] = {"scene": _scene(scene)}
    return Answer(_ask([*words, *_words({"out": out})], **of), _of_table(words, **of))


def enclose(scene: Scene | PathLike, box: Mapping[str, Any] | None = None, **options: Any) -> Answer:
    """Two numbers between which every answer of the scene as written is proved to lie.

    Parameters
    ----------
    scene : Scene or str
        With an impact velocity.
    box : dict, optional
        Least and greatest value of numbers of the scene, by their paths: ``{"target.strength": ("34MPa", "38MPa")}``. The answers are
        then those of all of the box.
    **options
        Those of the command.

    Returns
    -------
    Answer
        The fields of ``penetrode solve --method enclosure --json``; ``enclosure`` has ``depth_m`` [m], ``time_s`` [s] and
        ``velocity_m_s`` [m/s], each as least and greatest number. V_c: ``pn.critical(scene, "enclosure").enclosure``.

    Raises
    ------
    OptionError, SceneError, RunError
        As the command.

    Examples
    --------
    >>> import penetrode as pn
    >>> pn.enclose("tunnel").enclosure["depth_m"]
    [0.14482620011221706, 0.14482620011221709]
    """
    ranges = [f"{path}={_colons(value)}" for path, value in (box or {}).items()]
    words = ["solve", "--method=enclosure", *_words({"box": ranges, **options})]
    return Answer(_ask(words, _scene(scene)))


def limit(scene: Scene | PathLike, **options: Any) -> Answer:
    """The perforation limit: the thickness that just stops the projectile.

    Parameters
    ----------
    scene : Scene or str
        With an impact velocity.
    **options
        Those of the command.

    Returns
    -------
    Answer
        The fields of ``penetrode limit --json``.

    Raises
    ------
    OptionError, SceneError, RunError
        As the command.

    Examples
    --------
    >>> import penetrode as pn
    >>> pn.limit("tunnel").schema
    'penetrode/limit/1'
    """
    return Answer(_ask(["limit", *_words(options)], _scene(scene)))


def formulas(scene: Scene | PathLike, out: PathLike | None = None, **options: Any) -> Answer:
    """Depth, perforation limit and scabbing limit by the published formulas, beside the equation of motion.

    Parameters
    ----------
    scene : Scene or str
        With an impact velocity; its thickness does not count.
    out : path, optional
        CSV file for the formulas over the impact velocity; the figure goes beside it.
    **options
        Those of the command: `nose`, `aggregate`, and the method and its options.

    Returns
    -------
    Answer
        With ``formulas``: ``name``, ``year``, ``sources``, ``depth_m``, ``perforation_m``, ``scabbing_m`` [m], and ``not_valid``, why
        there is none.

    Raises
    ------
    OptionError, SceneError, RunError
        As the command: a scene of stages or layers has no formulas.

    Notes
    -----
    Each formula names its sources, and whether it was read in two places: ``confirmed``.

    Examples
    --------
    >>> import penetrode as pn
    >>> found = pn.formulas("paper-slab")
    >>> found.formulas[0]["name"], round(found.formulas[0]["depth_m"], 6)
    ('equation of motion, x = H', 0.356909)
    """
    words = ["formulas", *_words(options)]
    of: dict[str, Any] = {"scene": _scene(scene)}
    return Answer(_ask([*words, *_words({"out": out})], **of), _of_table(words, **of))


def export(scene: Scene | PathLike, out: PathLike, code: str = "abaqus", *, dt: float | str | None = None) -> Answer:
    """A scene as what a finite element code runs, and what to expect of it.

    Parameters
    ----------
    scene : Scene or str
        With an impact velocity; a stage whose force is an expression is refused.
    out : path
        Folder to write; one that holds anything else is left alone.
    code : {"abaqus"}
        The code.
    dt : float or str, optional
        Fixed time increment [s], or a text such as "1 us"; by default from the stages.

    Returns
    -------
    Answer
        With ``files``, ``exact``, and ``expected``: depth, time and velocity at that increment and its halves.

    Raises
    ------
    OptionError, SceneError, RunError
        As the command.

    Examples
    --------
    >>> import tempfile
    >>> import penetrode as pn
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = pn.export("paper-slab", folder + "/slab", dt="2 us")
    >>> "vdload.f" in found.files, found.dt_s
    (True, 2e-06)
    """
    return Answer(_ask(["export", code, *_words({"out": os.fspath(out), "dt": dt})], _scene(scene)))


def map(k: float = 2.0, out: PathLike | None = None) -> Answer:
    """How far Eq. 11-12 may be trusted: lines of equal error over (I, N).

    Parameters
    ----------
    k : float, default 2
        Crater depth in diameters.
    out : path, optional
        CSV file for the lines; the figure goes beside it.

    Returns
    -------
    Answer
        With ``lines``: ``level``, ``points`` [(I, N), ...], and ``scenes``, the measured tests.

    Raises
    ------
    OptionError
        `k` is not above zero.

    Notes
    -----
    Eq. 11-12: Li and Chen (2003).

    Examples
    --------
    >>> import penetrode as pn
    >>> sorted({line["level"] for line in pn.map().lines})
    [0.01, 0.05, 0.2]
    """
    words = ["map", *_words({"k": k})]
    return Answer(_ask([*words, *_words({"out": out})]), _of_table(words))


def experiments(data: PathLike | None = None, **options: Any) -> Answer:
    """Measured depths beside predicted ones: shipped data, or your own.

    Parameters
    ----------
    data : path, optional
        A CSV as ``penetrode init data`` writes it.
    **options
        Those of the command.

    Returns
    -------
    Answer

    Raises
    ------
    OptionError
        Data that cannot be read.
    """
    words = ["experiments", *([] if data is None else [os.fspath(data)]), *_words(options)]
    return Answer(_ask(words))


def _program() -> str:
    """The command `penetrode` of this environment."""
    found = shutil.which("penetrode", path=os.path.dirname(sys.executable)) or shutil.which("penetrode")
    if found is None:
        raise RunError(
            "the command penetrode is not there, and claims about what it prints run it",
            "install the package with pip, and let its scripts be on the PATH",
        )
    return found


def verify(
    suite: PathLike | None = None, *, only: str | Sequence[str] = (), out: PathLike | None = None, **options: Any
) -> Answer:
    """The verification suite: every claim, judged.

    Parameters
    ----------
    suite : path, optional
        A suite file; by default the suite that ships.
    only : str or sequence of str
        Only claims whose id contains this, or matches it with ``*`` and ``?``.
    out : path, optional
        Folder of the report; without it none is kept.
    **options
        Those of the command: `seed`, `data`, `peer`, `live_peers`.

    Returns
    -------
    Answer
        With ``verdict``, ``counts``, ``claims``.

    Raises
    ------
    OptionError, RunError
        As the command.

    Examples
    --------
    >>> import penetrode as pn
    >>> pn.verify(only="closed-form/50-digits/tunnel").verdict
    'passed'
    """
    _penetrode.let_program_be(_program())
    patterns = [only] if isinstance(only, str) else list(only)
    words = ["verify", *([] if suite is None else [os.fspath(suite)]), *_words({"only": patterns, **options})]
    if out is not None:
        return Answer(_ask([*words, f"--out={os.fspath(out)}"]))
    with tempfile.TemporaryDirectory(prefix="penetrode-") as folder:
        data, text, code, said = _ask([*words, f"--out={folder}/report"])
        # There is no report any more.
        text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("report: "))
        return Answer((data, text, code, said))


def diagnose(
    solver: Solver | str,
    *,
    name: str | None = None,
    seed: int = 1,
    questions: int = 200,
    fixed_step: bool = False,
    reads: str = "stages",
    order: float | Mapping[str, float] | None = None,
    out: PathLike | None = None,
    silence: float = 30.0,
) -> Answer:
    """Is a solver right, and if not, what is wrong with it?

    Parameters
    ----------
    solver : callable or str
        Of a `Problem`, to depth [m], time [s] and velocity [m/s] at rest or at the exit; in a row, or a dict with
        ``depth_m, time_s, velocity_m_s`` and, if it likes, ``outcome``, ``events`` [(name, stage, time, depth, velocity)] and
        ``force_evaluations``. See `by_stages` and `ivp`. A text is the command of a program that speaks the peer protocol.
    name : str, optional
        What it is called.
    seed, questions : int
        Seed and number of the questions, 24 to 10000.
    fixed_step : bool, default False
        It takes ``problem.dt`` as its step.
    reads : {"stages", "scene"}
        ``scene``: it is asked physical scenes alone and answers from ``problem.scene``.
    order : float or dict, optional
        The order of convergence that it claims, events included.
    out : path, optional
        Folder of the report.
    silence : float, default 30
        Longest wait for one answer [s].

    Returns
    -------
    Answer
        With ``verdict`` (``passed`` is sound), ``causes`` (best first: ``id``, ``factor``, ``certainty``, ``statement``) and
        ``questions``.

    Raises
    ------
    RunError
        It gives no number to any question, or hangs on one.
    OptionError
        An option out of range.

    Notes
    -----
    A question costs the call and less than a microsecond. What the callable raises fails its question; an interrupt is passed on.
    A callable that hangs is left alone with its thread.

    Examples
    --------
    >>> import penetrode as pn
    >>> def half(problem):
    ...     end = 0.5 * problem.velocity
    ...     return end, 1.0, 0.0
    >>> pn.diagnose(half, questions=24).verdict
    'failed'
    """
    if isinstance(solver, str):
        if name is not None or fixed_step or reads != "stages" or order is not None:
            raise OptionError("a program says itself what it is", "put it into its answer to `hello`")
        words = ["diagnose", solver, *_words({"seed": seed, "questions": questions})]
        return Answer(_ask([*words, *_words({"out": out})]), _of_report(words))
    if not callable(solver):
        raise OptionError(f"a {type(solver).__name__} is no solver", "give a callable, or the command of a program")
    if reads not in ("stages", "scene"):
        raise OptionError(f"reads = {reads!r} is not allowed", "choose among stages, scene")
    if not 24 <= questions <= 10_000:
        raise OptionError(f"questions = {questions} is not allowed", "from 24 to 10000")
    orders = dict(order) if isinstance(order, Mapping) else {} if order is None else {"all": float(order)}
    if not all(value > 0 for value in orders.values()):
        raise OptionError(f"order = {order} is not allowed", "a number above zero")
    named: str = name or str(getattr(solver, "__name__", type(solver).__name__))
    if not silence > 0:
        raise OptionError(f"silence = {silence} is not allowed", "a time above zero, in seconds")
    with tempfile.TemporaryDirectory(prefix="penetrode-") as folder:
        report = os.fspath(out) if out is not None else f"{folder}/report"
        data, text, code, said = _penetrode.diagnose(
            solver, named, seed, questions, fixed_step, reads == "scene", orders, report, silence
        )
        figures = [path.read_text("utf-8") for path in sorted(Path(report, "figures").glob("*.svg"))]
        if out is None:
            text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("report: "))
    return Answer((data, text, code, said), figures=figures)
