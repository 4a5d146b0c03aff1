"""Time of one solution of the laws that ship: this program, heyoka and scipy, at the same impact speeds.

    cargo bench --manifest-path benches/flights/Cargo.toml -- laws
    python benches/laws.py target/release/penetrode

Ours is what the bench has measured (taylor, all events, one core); heyoka (compiled, tol 1e-15) and scipy (DOP853, rtol 1e-12)
run here, called from Python. Needs heyoka and scipy (`verification/peers/requirements-heyoka.txt`, `requirements.txt`).
Each answer is compared with ours first. Laws whose stages end elsewhere than at a depth are left out.
"""

import json
import math
import os
import pathlib
import re
import subprocess
import sys
import time

import heyoka as hy
import numpy as np
from scipy.integrate import solve_ivp

TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR") or pathlib.Path(__file__).parent / "flights/target")
NAMES = ["sqrt", "exp", "log", "tanh", "sin", "cos", "atan"]


def run(program, *arguments):
    return json.loads(subprocess.run([program, *arguments, "--json"], capture_output=True, check=True).stdout)


def force_of(text, parameters, functions, x, v):
    """The force of `text` in the numbers of `functions`."""
    names = {**parameters, **functions, "x": x, "V": v, "pi": math.pi, "e": math.e}
    return eval(text.replace("^", "**"), {"__builtins__": {}}, names)


def text_of(scene, index):
    for own in scene["forces"]:
        if own["stage"] == index:
            return own["force"]
    stage = scene["stages"][index]
    p, s, r, q = (stage[key] or 0.0 for key in ("static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m"))
    return f"{p!r} + {s!r}*x + {r!r}*V + {q!r}*V^2"


def stages_of(scene):
    """Text of the force and end of each stage up to the far side."""
    exit_depth = scene["exit_depth_m"] or math.inf
    for index, stage in enumerate(scene["stages"]):
        end = min(stage["end_m"] or math.inf, exit_depth)
        yield text_of(scene, index), end
        if end == exit_depth:
            return


def with_heyoka(scene, parameters):
    """A function from the impact speed to depth, velocity and time."""
    x, v = hy.make_vars("x", "V")
    either = lambda name: lambda z: getattr(math, name)(z) if isinstance(z, (int, float)) else getattr(hy, name)(z)
    functions = {name: either(name) for name in NAMES}
    functions |= {"log10": lambda z: functions["log"](z) / math.log(10.0)}
    functions |= {"max": lambda a, b: hy.select(hy.gt(a, b), a, b), "min": lambda a, b: hy.select(hy.lt(a, b), a, b)}
    functions |= {"abs": lambda a: hy.sqrt(a * a)}
    stages = []
    for text, end in stages_of(scene):
        force = hy.expression(0.0) + force_of(text, parameters, functions, x, v)
        events = [hy.t_event(v, direction=hy.event_direction.negative)]
        if math.isfinite(end):
            events.append(hy.t_event(x - end, direction=hy.event_direction.positive))
        system = [(x, v), (v, -force / scene["mass_kg"])]
        stages.append((hy.taylor_adaptive(system, [0.0, 1.0], tol=1e-15, t_events=events), end))

    def solve(speed):
        t, depth, velocity = 0.0, 0.0, speed
        for integrator, end in stages:
            integrator.reset_cooldowns()
            integrator.state[0], integrator.state[1] = depth, velocity
            integrator.time = t
            integrator.propagate_until(t + 1.0)
            depth, velocity = integrator.state
            t = integrator.time
            if velocity <= 1e-9 * speed:
                break
        return depth, velocity, t

    return solve


def with_scipy(scene, parameters):
    functions = {name: getattr(math, name) for name in NAMES + ["log10"]} | {"max": max, "min": min, "abs": abs}
    codes = [
        (eval(f"lambda x, V: {text.replace('^', '**')}", {**parameters, **functions, "pi": math.pi, "e": math.e}), end)
        for text, end in stages_of(scene)
    ]

    def solve(speed):
        t, depth, velocity = 0.0, 0.0, speed
        for force, end in codes:
            events = [lambda _, y: y[1]] + ([lambda _, y, end=end: y[0] - end] if math.isfinite(end) else [])
            for event in events:
                event.terminal = True
            rate = lambda _, y: (y[1], -force(y[0], max(y[1], 0.0)) / scene["mass_kg"])
            done = solve_ivp(rate, (t, t + 1.0), (depth, velocity), "DOP853", rtol=1e-12, atol=1e-13, events=events)
            t, (depth, velocity) = done.t[-1], done.y[:, -1]
            if velocity <= 1e-9 * speed:
                break
        return depth, velocity, t

    return solve


def microseconds(solve, speeds, repeats):
    best = math.inf
    for _ in range(repeats):
        start = time.perf_counter()
        for speed in speeds:
            solve(speed)
        best = min(best, time.perf_counter() - start)
    return 1e6 * best / len(speeds)


def main(program):
    listed = subprocess.run([program, "scenes"], capture_output=True, check=True, text=True).stdout
    print(f"{'law':24} {'penetrode':>9} {'heyoka':>9} {'scipy':>9}   us a solution; largest difference of theirs from ours")
    for name in sorted(set(re.findall(r"^\s*(law-\S+)", listed, re.M))):
        try:
            found = run(program, "solve", name)
        except subprocess.CalledProcessError:
            continue  # it only approaches a depth
        scene = found["scene"]
        if "parameters" not in scene or scene.get("ends"):
            continue
        parameters = {one["name"]: one["value"] for one in scene["parameters"]}
        golden = 0.6180339887498948
        speeds = [scene["velocity_m_s"] * (0.8 + 0.4 * ((i * golden) % 1.0)) for i in range(200)]
        measured = TARGET / f"criterion/laws/{name}/new/estimates.json"
        ours = json.loads(measured.read_text())["median"]["point_estimate"] / 200e3 if measured.exists() else math.nan
        row, errors = [], []
        for make, repeats in ((with_heyoka, 5), (with_scipy, 1)):
            try:
                solve, worst = make(scene, parameters), 0.0
                for speed in speeds[:3]:
                    end = run(program, "solve", name, "--set", f"impact.velocity={speed!r}")
                    depth, velocity, _ = solve(speed)
                    off = max(abs(depth / end["depth_m"] - 1.0), abs(velocity - end["velocity_m_s"]) / speed)
                    worst = max(worst, off)
                errors.append(worst)
                row.append(microseconds(solve, speeds if repeats > 1 else speeds[:20], repeats))
            except Exception as error:  # what another program cannot do is its row
                errors.append(math.nan)
                row.append(math.nan)
                print(f"  {name}, {make.__name__}: {error}", file=sys.stderr)
        print(f"{name:24} {ours:9.2f} {row[0]:9.2f} {row[1]:9.0f}   {errors[0]:.0e} {errors[1]:.0e}", flush=True)


if __name__ == "__main__":
    np.seterr(all="ignore")
    hy.set_logger_level_error()  # a law without an end at a depth warns of each step
    main(sys.argv[1])
