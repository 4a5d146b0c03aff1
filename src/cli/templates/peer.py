#!/usr/bin/env python3
"""A solver of your own, asked by penetrode: it reads one question a line and answers one a line, both in JSON.

    penetrode diagnose "python3 peer.py"                         what is wrong?
    penetrode verify --only peer/user --peer "python3 peer.py"   does it agree?

It runs as it stands. YOUR INTEGRATOR GOES INTO `solve_stage`; all below it is the protocol and may stay as it is.
SI units throughout. In each stage, with x counted from the impact face,

    dx/dt = V,    M dV/dt = -(p + s x + r V + q V^2),    until V = 0, the end of the stage or the exit depth.
"""

import json
import math
import statistics
import sys
import time

# Who you are. A solver with steps of one size adds "fixed_step": True; each question then has the step to use,
# question["dt_s"], and rtol and atol mean nothing. One that computes its forces itself adds "reads": "scene"; each
# question then has the physical scene, question["scene"]: mass_kg, diameter_m, strength_pa ...
HELLO = {"name": "my solver", "version": "1.0", "method": "Dormand-Prince 5(4)"}

# The method of Dormand and Prince: a row for each evaluation after the first, the last at the new point, and what
# the new point has beyond that of order 4.
ROWS = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
STEPS_MAX = 200_000


def solve_stage(mass, p, s, r, q, limit, t, x, v, rtol, atol):
    """Flies through one stage from time t, depth x and velocity v > 0 until x = limit (may be infinite) or V = 0.

    Returns t, x, v there: x is `limit` itself where that was reached, and v is 0.0 where the projectile came to rest.
    """

    def acceleration(x, v):
        return -(p + s * x + (r + q * v) * v) / mass

    def step(h):
        """From x, v on by h: depth, velocity and acceleration there, and the estimated error over the tolerance."""
        slopes = [(v, a)]
        for row in ROWS:
            dx = dv = 0.0
            for weight, (slope_x, slope_v) in zip(row, slopes):
                dx += weight * slope_x
                dv += weight * slope_v
            x1, v1 = x + h * dx, v + h * dv
            slopes.append((v1, acceleration(x1, v1)))
        ex = h * sum(weight * slope[0] for weight, slope in zip(ERROR, slopes)) / (atol[0] + rtol * abs(x1))
        ev = h * sum(weight * slope[1] for weight, slope in zip(ERROR, slopes)) / (atol[1] + rtol * abs(v1))
        return x1, v1, slopes[-1][1], max(abs(ex), abs(ev))

    def shorten(h, gap):
        """The step, at most h, at whose end a gap is closed that is open at its start: Newton within a bracket.

        `gap(x, v, a)` gives the gap and its derivative in time.
        """
        low, high = 0.0, h
        for _ in range(100):
            x1, v1, a1, _ = step(h)
            open_by, rate = gap(x1, v1, a1)
            low, high = (h, high) if open_by > 0.0 else (low, h)
            change = -open_by / rate if rate != 0.0 else math.inf
            if abs(change) <= 1e-16 * h or high - low <= 1e-16 * h:
                break
            h = h + change if low < h + change < high else 0.5 * (low + high)
        return h, x1, v1

    a = acceleration(x, v)
    h = 0.01 * min((x + atol[0] / rtol) / v, v / abs(a) if a else math.inf)
    for _ in range(STEPS_MAX):
        x1, v1, a1, error = step(h)
        factor = max(0.2, min(5.0, 0.9 * max(error, 1e-9) ** -0.2))
        if not error <= 1.0:
            h *= factor
            continue
        # A step over the turning point may begin and end before the limit and pass it twice: the turning point first.
        if v1 <= 0.0:
            h, x1, v1 = shorten(h, lambda x1, v1, a1: (v1, a1))
            if x1 < limit:
                return t + h, x1, 0.0
        if x1 >= limit:
            h, x1, v1 = shorten(h, lambda x1, v1, a1: (limit - x1, -v1))
            return t + h, limit, max(v1, 0.0)
        t, x, v, a, h = t + h, x1, v1, a1, h * factor
    raise ArithmeticError(f"more than {STEPS_MAX} steps in a stage")


def solve(question):
    """One flight: from stage to stage until rest or exit, every event on the way listed."""
    mass, v, exit_depth = question["mass_kg"], question["velocity_m_s"], question["exit_depth_m"]
    exit_depth = math.inf if exit_depth is None else exit_depth
    t, x, outcome, events = 0.0, 0.0, "stopped", []

    def happened(event, **more):
        events.append({"event": event, **more, "time_s": t, "depth_m": x, "velocity_m_s": v})

    for index, stage in enumerate(question["stages"]):
        p, s, r, q = (stage[key] for key in ("static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m"))
        end = math.inf if stage["end_m"] is None else stage["end_m"]
        limit = min(end, exit_depth)
        if x < limit and v > 0.0:
            t, x, v = solve_stage(mass, p, s, r, q, limit, t, x, v, question["rtol"], question["atol"])
        if x < limit:
            break
        if end <= exit_depth:
            happened("stage-end", stage=index)
        if exit_depth <= end:
            happened("exit")
            outcome = "perforated"
            break
    if v == 0.0:
        happened("rest")
    return {"outcome": outcome, "depth_m": x, "time_s": t, "velocity_m_s": v, "events": events}


def answer(question):
    if "hello" in question:
        return json.dumps(HELLO)
    times = []
    try:
        for _ in range(question["repeats"]):  # more than one only where `bench` measures the time
            start = time.perf_counter_ns()
            flight = solve(question)
            times.append(time.perf_counter_ns() - start)
        return json.dumps({"id": question["id"], **flight, "wall_ns": statistics.median(times)}, allow_nan=False)
    except Exception as error:  # said in the answer; the next question may be solved
        return json.dumps({"id": question["id"], "error": f"{type(error).__name__}: {error}"})


if __name__ == "__main__":
    for line in sys.stdin:
        print(answer(json.loads(line)), flush=True)
