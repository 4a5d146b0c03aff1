"""Many scenes on a cluster: one Parquet file a task, named by the digest of its input.

A task writes its file beside its place and renames it, so that whatever is killed loses one file at most, and a second run
does what is missing. Nothing is shuffled, and no task waits for another. The numbers are those of `penetrode.batch` on one
core, bit for bit.

Needs ``pip install "penetrode[dask]"``.

Examples
--------
>>> from dask.distributed import Client                        # doctest: +SKIP
>>> import penetrode.dask
>>> client = Client("tcp://scheduler:8786")                    # doctest: +SKIP
>>> done = penetrode.dask.batch("scenes/*.parquet", "results")  # doctest: +SKIP
>>> done.rows, done.bad                                        # doctest: +SKIP
(10000000, 0)
"""

from __future__ import annotations

import glob
import hashlib
import importlib
import itertools
import math
import json
import os
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import _penetrode
from ._errors import OptionError, TableError
from ._penetrode import Scene

#: Rows of a piece of a sweep or of random scenes.
PIECE = 1_000_000

#: Beginning of the name of a file that is not whole yet.
_BESIDE = ".penetrode-"

#: Key of what a file of results says of itself.
_SAYS = b"penetrode"


@dataclass(frozen=True)
class Done:
    """What was done.

    Attributes
    ----------
    folder : pathlib.Path
        Where the files are; ``index.json`` in it names the file of each piece, in order.
    files : list of pathlib.Path
        One a piece, in the order of the pieces.
    rows, bad, undecided : int
        Over all files.
    new : int
        Files that this run made; the others were there.
    """

    folder: Path
    files: list[Path] = field(repr=False)
    rows: int
    bad: int
    undecided: int
    new: int

    def to_arrow(self) -> Any:
        """All results as one pyarrow.Table, in order."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        return pa.concat_tables([pq.read_table(path) for path in self.files])

    def dataframe(self) -> Any:
        """All results as a dask DataFrame, a partition a file."""
        import dask.dataframe as dd

        return dd.read_parquet([os.fspath(path) for path in self.files])


def _digest(*parts: bytes) -> str:
    """A name for `parts`: equal for equal ones, of this version."""
    digest = hashlib.blake2b(_penetrode.VERSION.encode(), digest_size=16)
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def _options(options: Mapping[str, Any]) -> bytes:
    """Options as bytes, the scene among them; how many threads work changes nothing."""
    given = {key: value for key, value in options.items() if key != "threads" and value is not None}
    if isinstance(given.get("scene"), Scene):
        given["scene"] = given["scene"].__reduce__()[1]
    return json.dumps(given, sort_keys=True).encode()


def _solve(name: str, folder: str, make: Callable[[], Any], options: dict[str, Any]) -> dict[str, Any]:
    """The results of the table that `make` makes, in the file `name` of `folder`; where it is there already, it is left."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = Path(folder, f"{name}.parquet")
    if path.exists():
        given = (pq.read_schema(path).metadata or {}).get(_SAYS)
        if given:
            return {**json.loads(given), "name": name, "new": 0}
    found = _penetrode.batch(make(), **options)
    table = pa.table(found)
    says = {"rows": len(found), "bad": found.bad, "undecided": found.undecided}
    table = table.replace_schema_metadata({_SAYS: json.dumps(says).encode()})
    beside = Path(folder, f"{_BESIDE}{name}-{uuid.uuid4().hex}")
    try:
        with open(beside, "wb") as file:
            pq.write_table(table, file, compression="snappy")
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
    return {**says, "name": name, "new": 1}


def _of_file(path: str, folder: str, options: dict[str, Any]) -> dict[str, Any]:
    """The results of the table at `path`."""
    data = Path(path).read_bytes()

    def make() -> Any:
        import pyarrow as pa

        if path.endswith(".csv"):
            from pyarrow import csv

            return csv.read_csv(pa.BufferReader(data))
        import pyarrow.parquet as pq

        return pq.read_table(pa.BufferReader(data))

    return _solve(_digest(data, _options(options)), folder, make, options)


def _of_partition(frame: Any, folder: str, options: dict[str, Any]) -> dict[str, Any]:
    """The results of one partition of a dask DataFrame."""
    import pyarrow as pa

    table = pa.Table.from_pandas(frame, preserve_index=False)
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    name = _digest(sink.getvalue().to_pybytes(), _options(options))
    return _solve(name, folder, lambda: table, options)


def _of_grid(axes: dict[str, list[float]], rows: range, folder: str, options: dict[str, Any]) -> dict[str, Any]:
    """The results of `rows` of the grid of `axes`, the last of which runs fastest."""
    import numpy as np

    def make() -> Any:
        places = np.unravel_index(np.arange(rows.start, rows.stop), [len(values) for values in axes.values()])
        return {path: np.asarray(values)[place] for (path, values), place in zip(axes.items(), places)}

    name = _digest(json.dumps([axes, rows.start, rows.stop]).encode(), _options(options))
    return _solve(name, folder, make, options)


def _of_chance(
    means: dict[str, float], spread: dict[str, float], seed: int, rows: range, folder: str, options: dict[str, Any]
) -> dict[str, Any]:
    """The results of `rows` random scenes about `means`."""
    import numpy as np

    def make() -> Any:
        # A stream of its own for each piece, and each number in it: no piece depends on who does it.
        table = {}
        for path, mean in means.items():
            chance = np.random.default_rng([seed, rows.start, *path.encode()])
            table[path] = mean * (1.0 + spread[path] * chance.standard_normal(len(rows)))
        return table

    name = _digest(json.dumps([means, spread, seed, rows.start, rows.stop]).encode(), _options(options))
    return _solve(name, folder, make, options)


def _run(
    work: Callable[..., dict[str, Any]],
    each: Iterable[tuple[Any, ...]],
    out: str | os.PathLike[str],
    options: dict[str, Any],
    client: Any,
    progress: bool,
) -> Done:
    """Does `work`, a task for each of `each`, into the folder `out`, and writes the index of what they made."""
    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise OptionError(f"{folder} is a file", "name a folder for the results")
    folder.mkdir(parents=True, exist_ok=True)
    if client is None:
        try:
            from distributed import get_client

            client = get_client()
        except (ImportError, ValueError):
            client = None
    # A worker does several tasks at once. Here one uses all cores; more of them would only fill the memory.
    options = {"threads": None if client is None else 1, **options}
    delayed: Any = importlib.import_module("dask").delayed
    tasks = [delayed(work, pure=False)(*given, os.fspath(folder.resolve()), options) for given in each]
    if client is not None:
        futures = client.compute(tasks)
        if progress:
            import distributed

            bar: Any = distributed.progress
            bar(futures, notebook=False)
        said = client.gather(futures)
    else:
        said = [task.compute(scheduler="synchronous") for task in tasks]
    names = [one["name"] for one in said]
    # What a killed task left of these files; the files themselves are whole.
    for beside in folder.glob(f"{_BESIDE}*"):
        if beside.name.removeprefix(_BESIDE).split("-")[0] in names:
            beside.unlink(missing_ok=True)
    index = folder / f"{_BESIDE}index"
    index.write_text(json.dumps([f"{name}.parquet" for name in names], indent=0))
    os.replace(index, folder / "index.json")
    total = {key: sum(one[key] for one in said) for key in ("rows", "bad", "undecided", "new")}
    return Done(folder=folder, files=[folder / f"{name}.parquet" for name in names], **total)


def _files(source: Any) -> Iterator[str]:
    """The files that `source` names."""
    paths: list[str] = []
    for one in [source] if isinstance(source, (str, os.PathLike)) else list(source):
        path = os.fspath(one)
        if os.path.isdir(path):
            paths += sorted(glob.glob(os.path.join(glob.escape(path), "*.parquet")))
        else:
            paths += sorted(glob.glob(path)) or [path]
    if not paths:
        raise TableError(f"there is no table in {source!r}", "name Parquet or CSV files")
    for path in paths:
        if not os.path.isfile(path):
            raise TableError(f"{path}: there is no such file", "check the path; it must be there for all workers")
    yield from map(os.path.abspath, paths)


def batch(
    source: Any,
    out: str | os.PathLike[str],
    *,
    client: Any = None,
    progress: bool = False,
    **options: Any,
) -> Done:
    """Solve the scenes of many files, or of a dask DataFrame; one task and one file of results each.

    Parameters
    ----------
    source : path, list of paths or dask DataFrame
        Parquet or CSV files, a folder or a pattern such as ``"scenes/*.parquet"``; columns as in `penetrode.batch`.
    out : path
        Folder of the results, which all workers see.
    client : distributed.Client, optional
        By default the one of this program; without one, the tasks are done here.
    progress : bool, default False
        Show a bar.
    **options
        As in `penetrode.batch`; `threads` is 1 a task on a cluster, since a worker does several.

    Returns
    -------
    Done

    Raises
    ------
    TableError
        A table that cannot be read, or no file.

    Examples
    --------
    >>> import tempfile
    >>> import penetrode.dask
    >>> with tempfile.TemporaryDirectory() as folder:                # doctest: +SKIP
    ...     penetrode.dask.batch("scenes.csv", folder).rows
    3
    """
    if hasattr(source, "to_delayed"):
        return _run(_of_partition, ((part,) for part in source.to_delayed()), out, options, client, progress)
    return _run(_of_file, ((path,) for path in _files(source)), out, options, client, progress)


def _pieces(count: int, piece: int) -> list[range]:
    if not 1 <= piece:
        raise OptionError(f"piece = {piece} is not allowed", "a number of rows above zero")
    return [range(first, min(first + piece, count)) for first in range(0, count, piece)]


def sweep(
    scene: Scene,
    out: str | os.PathLike[str],
    axes: Mapping[str, Sequence[float]],
    *,
    piece: int = PIECE,
    client: Any = None,
    progress: bool = False,
    **options: Any,
) -> Done:
    """Solve a scene at every point of a grid over any numbers of it.

    Parameters
    ----------
    scene : Scene
    out : path
        Folder of the results; row numbers of a file begin with 1, and the last axis runs fastest.
    axes : dict of sequences of float
        Values of each number, by path and in SI units: ``{"impact.velocity": [...], "target.strength": [...]}``.
    piece : int, default 1000000
        Rows of a file.
    client, progress, **options
        As in `batch`.

    Returns
    -------
    Done

    Raises
    ------
    OptionError
        An axis without a value.
    """
    grid = {path: [float(value) for value in values] for path, values in axes.items()}
    if not grid or not all(grid.values()):
        raise OptionError("an axis has no value", "give each path a list of numbers")
    count = math.prod(map(len, grid.values()))
    each = ((grid, rows) for rows in _pieces(count, piece))
    return _run(_of_grid, each, out, {"scene": scene, **options}, client, progress)


def monte_carlo(
    scene: Scene,
    out: str | os.PathLike[str],
    spread: Mapping[str, float],
    samples: int,
    *,
    seed: int = 1,
    piece: int = PIECE,
    client: Any = None,
    progress: bool = False,
    **options: Any,
) -> Done:
    """Solve random scenes about one: numbers that are normal, each with its relative standard deviation.

    Parameters
    ----------
    scene : Scene
    out : path
        Folder of the results. A number that is drawn out of its range is a bad row.
    spread : dict of float
        Relative standard deviation by path: ``{"target.strength": 0.05}``.
    samples : int
        How many.
    seed : int, default 1
        The same seed and pieces give the same numbers, whoever computes them.
    piece, client, progress, **options
        As in `sweep`.

    Returns
    -------
    Done

    Raises
    ------
    OptionError
        A path that the scene does not have as a number of its own.
    """
    known = _numbers(scene)
    for path in spread:
        if path not in known:
            raise OptionError(f"the scene has no number `{path}`", f"choose among {', '.join(known)}")
    means = {path: known[path] for path in spread}
    spreads = {path: float(value) for path, value in spread.items()}
    each = ((means, spreads, seed, rows) for rows in _pieces(samples, piece))
    return _run(_of_chance, each, out, {"scene": scene, **options}, client, progress)


def _numbers(scene: Scene) -> dict[str, float]:
    """The numbers that the scene states, by path."""
    given = scene.to_dict()
    names = {
        "projectile.mass": "mass_kg",
        "projectile.diameter": "diameter_m",
        "projectile.nose.factor": "nose_factor",
        "target.strength": "strength_pa",
        "target.density": "density_kg_m3",
        "target.thickness": "thickness_m",
        "resistance.S": "S",
        "resistance.B": "B",
        "resistance.k": "k",
        "impact.velocity": "velocity_m_s",
    }
    numbers = {path: given[name] for path, name in names.items() if given[name] is not None}
    own = {f"parameters.{one['name']}": one["value"] for one in given.get("parameters", [])}
    return dict(itertools.chain(numbers.items(), own.items()))
