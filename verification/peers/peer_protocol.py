"""The line protocol of a peer: one JSON object a line in, one a line out.

A peer program says how it solves one stage; everything else (reading and checking requests, walking from stage to
stage, naming events, timing, answering) is here and the same for all. The equation of motion of a stage is

    M x'' = -(p + s x + r V + q V^2),    until x = limit or V = 0,

smooth everywhere: nothing branches on x inside the force, each stage is a problem of its own.
Only the standard library is used, so that a missing package is reported by the peer that needs it.
"""

import argparse
import json
import math
import os
import statistics
import sys
import time
from typing import Callable, NamedTuple

MISSING_PACKAGE = 5
"""Exit code of a peer whose package is not installed."""

REPEATS_MAX = 100_000


class Stage(NamedTuple):
    """Force p + s x + r V + q V^2 [N] until `limit` [m]: the end of the stage or the exit depth."""

    mass: float
    p: float
    s: float
    r: float
    q: float
    limit: float

    def force(self, x, v):
        return self.p + self.s * x + (self.r + self.q * v) * v


class Landing(NamedTuple):
    """Where the flight through one stage ended: at the limit, at rest, or (touching) both."""

    t: float
    x: float
    v: float
    at_limit: bool
    at_rest: bool
    force_evaluations: int


class Request(NamedTuple):
    """A request whose numbers have been checked."""

    velocity: float
    exit_depth: float
    rtol: float
    atol: list
    repeats: int
    ends: list
    stages: list


class PeerError(Exception):
    """Something to say in the `error` of the answer."""


SolveStage = Callable[[float, float, float], Landing]
"""Solves one stage from (t, x, V)."""


def number(value, what, low=-math.inf):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < low:
        raise PeerError(f"{what} is not an admissible number: {value!r}")
    return float(value)


def optional_depth(value, what):
    return math.inf if value is None else number(value, what, 0.0)


def parse_request(message) -> Request:
    mass = number(message.get("mass_kg"), "mass_kg", 5e-324)
    atol = message.get("atol")
    if not isinstance(atol, list) or len(atol) != 2:
        raise PeerError(f"atol is not a pair: {atol!r}")
    given = message.get("stages")
    if not isinstance(given, list) or not given or not all(isinstance(stage, dict) for stage in given):
        raise PeerError("stages is not a list of at least one stage")
    exit_depth = optional_depth(message.get("exit_depth_m"), "exit_depth_m")
    ends = [optional_depth(stage.get("end_m"), "end_m") for stage in given]
    if ends != sorted(ends) or math.isfinite(ends[-1]):
        raise PeerError("the ends of the stages fall, or the last one has an end")
    coefficients = ("static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m")
    stages = [
        Stage(mass, *(number(stage.get(key), key) for key in coefficients), min(end, exit_depth))
        for stage, end in zip(given, ends)
    ]
    repeats = message.get("repeats", 1)
    if isinstance(repeats, bool) or not isinstance(repeats, int) or not 1 <= repeats <= REPEATS_MAX:
        raise PeerError(f"repeats is not a count from 1 to {REPEATS_MAX}: {repeats!r}")
    return Request(
        number(message.get("velocity_m_s"), "velocity_m_s", 0.0),
        exit_depth,
        number(message.get("rtol"), "rtol", 5e-324),
        [number(atol[0], "atol[0]", 0.0), number(atol[1], "atol[1]", 0.0)],
        repeats,
        ends,
        stages,
    )


def natural_time(stage: Stage, x: float, v: float) -> float:
    """The shortest time in which something can happen in a stage [s]: a scale, from forces alone.

    The time to the limit at constant speed, the time to rest under the force as it is, a quarter of an oscillation.
    """
    scales = [stage.mass * v / abs(force) for force in (stage.p + stage.s * x, stage.force(x, v)) if force != 0.0]
    if stage.s > 0.0:
        scales.append(0.5 * math.pi * math.sqrt(stage.mass / stage.s))
    if math.isfinite(stage.limit):
        scales.append((stage.limit - x) / v)
    scales = [scale for scale in scales if math.isfinite(scale) and scale > 0.0]
    if not scales:
        raise PeerError("the flight never ends: no force and no limit")
    return min(scales)


def walk(request: Request, solvers: list) -> dict:
    """One flight from impact to rest or exit, stage by stage."""
    t, x, v = 0.0, 0.0, request.velocity
    at_rest, outcome, evaluations, events = v == 0.0, "stopped", 0, []

    def happened(event, **more):
        events.append({"event": event, **more, "time_s": t, "depth_m": x, "velocity_m_s": v})

    for index, (stage, end, solve_stage) in enumerate(zip(request.stages, request.ends, solvers)):
        # Several boundaries may lie at one place: those already reached are passed without a flight.
        if x < stage.limit:
            if at_rest:
                break
            landing = solve_stage(t, x, v)
            t, x, v, at_rest = landing.t, landing.x, landing.v, landing.at_rest
            evaluations += landing.force_evaluations
            if at_rest:
                v = 0.0
            if not landing.at_limit:
                break
            # The next stage starts on the boundary itself, not a rounding error beside it.
            x = stage.limit
        if end <= request.exit_depth:
            happened("stage-end", stage=index)
        if request.exit_depth <= end:
            happened("exit")
            outcome = "perforated"
            break
    if at_rest:
        happened("rest")
    return {
        "outcome": outcome,
        "depth_m": x,
        "time_s": t,
        "velocity_m_s": v,
        "events": events,
        "force_evaluations": evaluations or None,
    }


def timed(repeats: int, flight: Callable[[], object], lanes: int = 1):
    """Median and quartiles of the time of one flight [ns] over the repeats, two at least."""
    clock, times = time.perf_counter_ns, []
    flight()
    for _ in range(repeats):
        start = clock()
        flight()
        times.append((clock() - start) / lanes)
    low, median, high = statistics.quantiles(times, n=4, method="inclusive")
    return median, [low, high]


def solve_request(message, prepare, batch) -> dict:
    request = parse_request(message)
    solvers = prepare(request)
    started = time.perf_counter_ns()
    answer = walk(request, solvers)
    wall_ns, quartiles = time.perf_counter_ns() - started, None
    if request.repeats > 1:
        lanes, flight = batch(request) if batch else (1, lambda: walk(request, solvers))
        if batch:
            # Nobody times a flight that ends elsewhere than the one of the answer.
            depth = flight()[1]
            if not abs(depth - answer["depth_m"]) <= max(1e-9, 10.0 * request.rtol) * answer["depth_m"]:
                raise PeerError(f"the timed flight ends at {depth} m and the answer at {answer['depth_m']} m")
        wall_ns, quartiles = timed(request.repeats, flight, lanes)
    return {**answer, "wall_ns": wall_ns, "wall_ns_quartiles": quartiles, "error": None}


def refuse_token(token):
    raise ValueError(f"{token} is not a number of JSON")


def answer_line(line: str, hello: dict, prepare, batch) -> dict:
    ident = None
    try:
        message = json.loads(line, parse_constant=refuse_token)
        if not isinstance(message, dict):
            raise PeerError("not a JSON object")
        ident = message.get("id")
        if "hello" in message:
            return hello
        answer = {"id": ident, **solve_request(message, prepare, batch)}
        json.dumps(answer, allow_nan=False)
        return answer
    # Whatever a solver raises belongs in the answer: the peer lives on for the next request.
    except Exception as error:  # noqa: BLE001
        return {"id": ident, "error": str(error) or type(error).__name__}


def serve(name: str, version: str, method: str, prepare: Callable[[Request], list], batch=None) -> None:
    """Answers requests until standard input ends.

    `prepare(request)` gives one function a stage, each `(t, x, V) -> Landing`; it is called once a request, outside
    the timed part. `batch(request)`, where a peer has it, gives `(lanes, flight)` for timing several solves at once.
    """
    # Solver libraries print on standard output when they please; the protocol keeps it for itself.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    hello = {"name": name, "version": version, "method": method}
    try:
        for line in sys.stdin.buffer:
            if not line.strip():
                continue
            text = line.decode("utf-8", errors="replace")
            answers.write(json.dumps(answer_line(text, hello, prepare, batch), allow_nan=False) + "\n")
            answers.flush()
    except (BrokenPipeError, KeyboardInterrupt):
        # The asker is gone; a second complaint when the interpreter flushes would help nobody.
        os._exit(0)


def missing(package: str, requirements: str) -> None:
    """Ends the program because a package is not installed."""
    program = os.path.basename(sys.argv[0])
    print(f"{program}: {package} is not installed: python3 -m pip install -r {requirements}", file=sys.stderr)
    sys.exit(MISSING_PACKAGE)


def arguments(description: str, methods: list) -> argparse.ArgumentParser:
    """A parser with the option `--method`; the first of `methods` is the default."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--method", choices=methods, default=methods[0], help=f"default {methods[0]}")
    return parser
