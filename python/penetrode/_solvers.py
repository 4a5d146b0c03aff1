"""Solvers of your own, from what you have: a callable that flies one stage, or an integrator like `solve_ivp`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ._penetrode import Problem, Stage

#: Depth (m), time (s) and velocity (m/s) at the end of a flight, in a row or by name.
Ended = Sequence[float] | dict[str, Any]
#: A solver: of a problem, to its end.
Solver = Callable[[Problem], Ended]


def by_stages(
    fly: Callable[[Problem, Stage, float, tuple[float, float, float]], tuple[float, float, float]],
) -> Solver:
    """The solver that flies stage after stage by `fly`.

    Parameters
    ----------
    fly : callable
        ``fly(problem, stage, limit, (time, depth, velocity))`` gives time [s], depth [m] and velocity [m/s] where the flight
        reaches the depth `limit` [m] or comes to rest in front of it (velocity 0).

    Returns
    -------
    callable
        Of a problem, to depth, time and velocity, for `diagnose`.

    Raises
    ------
    Exception
        Whatever `fly` raises: it fails the question.

    Examples
    --------
    >>> import math
    >>> import penetrode as pn
    >>> def constant_force(problem, stage, limit, state):
    ...     t, x, v = state
    ...     a = stage.static_force / problem.mass          # the other terms are left out
    ...     w = v * v - 2 * a * (limit - x) if a else v * v
    ...     if w <= 0:
    ...         return t + v / a, x + v * v / (2 * a), 0.0
    ...     return t + 2 * (limit - x) / (v + math.sqrt(w)), limit, math.sqrt(w)
    >>> solver = pn.by_stages(constant_force)
    >>> solver(pn.Problem.of(pn.scene("constant-force")))["depth_m"]
    0.078125
    """

    def solve(problem: Problem) -> dict[str, Any]:
        time, depth, velocity = 0.0, 0.0, problem.velocity
        events: list[tuple[str, int | None, float, float, float]] = []
        outcome = "perforated"
        for index, stage in enumerate(problem.stages):
            limit = min(stage.end, problem.exit_depth)
            if depth < limit:
                time, depth, velocity = fly(problem, stage, limit, (time, depth, velocity))
            if limit == problem.exit_depth and depth >= limit:
                break
            if velocity <= 0.0 or depth < limit:
                outcome, velocity = "stopped", 0.0
                break
            events.append(("stage-end", index, time, depth, velocity))
        return {"outcome": outcome, "depth_m": depth, "time_s": time, "velocity_m_s": velocity, "events": events}

    solve.__name__ = getattr(fly, "__name__", "by_stages")
    return solve


def ivp(solve_ivp: Callable[..., Any] | None = None, **options: Any) -> Solver:
    """The solver that hands each stage to an integrator with the signature of `scipy.integrate.solve_ivp`.

    It is given the right-hand side ``(t, [x, V]) -> [V, -F/M]`` and two terminal events, the end of the stage and rest, the
    tolerances of the question, and a time after which it need not go on.

    Parameters
    ----------
    solve_ivp : callable, optional
        The integrator; that of scipy without it.
    **options
        What else it is given: ``method="DOP853"``.

    Returns
    -------
    callable
        Of a problem, to depth, time and velocity, for `diagnose`.

    Raises
    ------
    ImportError
        No integrator is given, and scipy is not installed.

    Examples
    --------
    >>> import penetrode as pn
    >>> solver = pn.ivp(method="DOP853")          # doctest: +SKIP
    >>> pn.diagnose(solver).verdict               # doctest: +SKIP
    'passed'
    """
    if solve_ivp is None:
        from scipy.integrate import solve_ivp as integrator
    else:
        integrator = solve_ivp

    def fly(
        problem: Problem, stage: Stage, limit: float, state: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        mass, force = problem.mass, stage.force
        start, depth, velocity = state

        def slope(_: float, y: Sequence[float]) -> list[float]:
            return [y[1], -force(y[0], y[1]) / mass]

        def end(_: float, y: Sequence[float]) -> float:
            return y[0] - limit if math.isfinite(limit) else -1.0

        def rest(_: float, y: Sequence[float]) -> float:
            return y[1]

        end.terminal, end.direction = True, 1.0  # type: ignore[attr-defined]
        rest.terminal, rest.direction = True, -1.0  # type: ignore[attr-defined]
        rtol = problem.rtol
        horizon = 1e3 * max(problem.atol[0] / rtol, 1e-300) / max(problem.velocity, 1e-300)
        y = [depth, velocity]
        # Bounded: the horizon grows a thousandfold each time.
        for _ in range(8):
            found = integrator(
                slope,
                (start, start + horizon),
                y,
                events=(end, rest),
                rtol=max(rtol, 2.3e-14),
                atol=problem.atol,
                **options,
            )
            if not found.success:
                raise RuntimeError(found.message)
            ends, rests = found.t_events
            if len(ends) and (not len(rests) or ends[0] <= rests[0]):
                return float(ends[0]), limit, max(float(found.y_events[0][0][1]), 0.0)
            if len(rests):
                return float(rests[0]), float(found.y_events[1][0][0]), 0.0
            start, y = float(found.t[-1]), [float(found.y[0][-1]), float(found.y[1][-1])]
            horizon *= 1e3
        raise RuntimeError("the flight has no end within the time given")

    solver = by_stages(fly)
    name = options.get("method", "")
    named = f"{getattr(integrator, '__name__', 'ivp')} {getattr(name, '__name__', name)}".strip()
    setattr(solver, "__name__", named)
    return solver
