"""penetrode: verify integrators of the equation of motion of a rigid projectile in concrete.

M dV/dt = -F(x, V); F = c x in the crater, P + Q V^2 in the tunnel, until rest or the far side. Quantities are in SI units,
or texts with a unit. Every number is that of the command ``penetrode``, which comes with the package: studies answer what
its ``--json`` prints.

Examples
--------
>>> import penetrode as pn
>>> scene = pn.scene("paper-slab")
>>> round(pn.critical(scene).velocity, 9)
177.949686028
"""

from __future__ import annotations

from ._errors import Error, OptionError, RunError, SceneError, TableError
from ._penetrode import (
    VERSION as __version__,
    Event,
    Flight,
    Problem,
    Scene,
    Stage,
    Table,
    batch,
    scene_names,
    solve,
)
from ._solvers import by_stages, ivp
from ._studies import (
    Answer,
    Critical,
    audit,
    converge,
    critical,
    diagnose,
    enclose,
    experiments,
    export,
    formulas,
    limit,
    map,
    scene,
    sweep,
    verify,
)

__all__ = [
    "Answer",
    "Critical",
    "Error",
    "Event",
    "Flight",
    "OptionError",
    "Problem",
    "RunError",
    "Scene",
    "SceneError",
    "Stage",
    "Table",
    "TableError",
    "__version__",
    "audit",
    "batch",
    "by_stages",
    "converge",
    "critical",
    "diagnose",
    "enclose",
    "experiments",
    "export",
    "formulas",
    "ivp",
    "limit",
    "map",
    "scene",
    "scene_names",
    "solve",
    "sweep",
    "verify",
]
