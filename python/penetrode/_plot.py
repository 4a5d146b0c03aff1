"""Drawings on matplotlib axes, where it is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._penetrode import Flight
    from ._studies import Answer


def new_axes(count: int) -> Any:
    """`count` new axes in a row."""
    from matplotlib import pyplot

    _, axes = pyplot.subplots(1, count, figsize=(5.0 * count, 3.6), layout="constrained", squeeze=False)
    return axes[0]


def flight(flight: Flight, axes: Any = None) -> Any:
    """Depth and velocity of `flight` over time, its events marked."""
    axes = new_axes(2) if axes is None else axes
    path = flight.trajectory()
    events = flight.events
    for ax, name, unit, scale in ((axes[0], "depth", "mm", 1e3), (axes[1], "velocity", "m/s", 1.0)):
        ax.plot(1e3 * path["time"], scale * path[name])
        ax.plot([1e3 * e.time for e in events], [scale * getattr(e, name) for e in events], "o")
        ax.set(xlabel="t (ms)", ylabel=f"{name} ({unit})")
    return axes


def errors(answer: Answer, ax: Any = None) -> Any:
    """Errors over the step or the tolerance, one line a quantity."""
    ax = new_axes(1)[0] if ax is None else ax
    size = "step (s)"
    for quantity in answer.quantities:
        points = [p for p in quantity["points"] if p.get("error")]
        if any(p.get("rtol") for p in points):
            size = "relative tolerance"
        sizes = [p.get("dt_s") or p.get("rtol") for p in points]
        order = quantity["observed_order"]
        label = quantity["quantity"] + ("" if order is None else f", order {order:.2f}")
        ax.loglog(sizes, [abs(p["error"]) for p in points], "o-", label=label)
    ax.set(xlabel=size, ylabel="relative error")
    ax.legend()
    return ax


def swept(answer: Answer, ax: Any = None) -> Any:
    """Critical velocity along the first number that was varied, one line for each value of the second."""
    ax = new_axes(1)[0] if ax is None else ax
    lines: dict[float | None, list[tuple[float, float]]] = {}
    for row in answer.rows:
        first, *second = row["values"]
        if row["critical_velocity_m_s"] is not None:
            lines.setdefault(second[0] if second else None, []).append((first, row["critical_velocity_m_s"]))
    names = [axis["path"] for axis in answer.axes]
    for value, points in lines.items():
        ax.plot(*zip(*points), label=None if value is None else f"{names[1]} = {value:g}")
    ax.set(xlabel=names[0], ylabel="V_c (m/s)")
    if None not in lines and lines:
        ax.legend()
    return ax


def lines(answer: Answer, ax: Any = None) -> Any:
    """Lines of equal error of Eq. 11-12 over (I, N)."""
    ax = new_axes(1)[0] if ax is None else ax
    for line in answer.lines:
        ax.loglog(*zip(*line["points"]), label=f"{100 * line['level']:g} %")
    ax.set(xlabel="I", ylabel="N")
    ax.legend(title="error of Eq. 11-12")
    return ax
