"""Records what the peers answer, with provenance: `python3 verification/references/record.py`.

Sets up a virtual environment with the pinned packages (or takes `--python`, an interpreter that has them), asks every
program below for every scene below, and writes one file a program beside this script. `penetrode verify` compares
with these files by default and asks the programs themselves with `--live-peers`.
"""

import argparse
import datetime
import json
import math
import pathlib
import platform
import subprocess
import sys
import venv

HERE = pathlib.Path(__file__).resolve().parent
PEERS = HERE.parent / "peers"
REQUIREMENTS = ["requirements.txt", "requirements-heyoka.txt"]

PROGRAMS = [
    # file, command, relative tolerance: the tightest at which the program is known to work well
    ("sundae-adams.json", ["sundae_peer.py", "--method", "adams"], 1e-12),
    ("sundae-bdf.json", ["sundae_peer.py", "--method", "bdf"], 1e-12),
    ("sundae-ida.json", ["sundae_peer.py", "--method", "ida"], 1e-12),
    ("heyoka-taylor.json", ["heyoka_peer.py"], 1e-15),
]


def stage(p=0.0, s=0.0, r=0.0, q=0.0, end=None):
    return {"static_force_n": p, "stiffness_n_m": s, "viscosity_kg_s": r, "drag_kg_m": q, "end_m": end}


def concrete(mass, diameter, nose_factor, strength, density, static_factor, velocity, inertia=1.0, c=None, ratio=2.0):
    """Crater and tunnel of Eq. 4-5; the crater constant c continuous unless given."""
    area = 0.25 * math.pi * diameter**2
    force, drag = area * static_factor * strength, area * nose_factor * inertia * density
    depth = ratio * diameter
    if c is None:
        c = mass * (force + drag * velocity**2) / (depth * (mass + depth * drag))
    return [stage(s=c, end=depth), stage(p=force, q=drag)]


BLUNT = {"mass": 2.0, "diameter": 0.05, "nose_factor": 0.72, "strength": 36e6, "density": 2300.0, "static_factor": 12.0}
SHOT_14 = {"mass": 0.906, "diameter": 0.0269, "nose_factor": 0.15625, "strength": 35.2e6, "density": 2370.0, "static_factor": 12.0}


def blunt(velocity, **more):
    return concrete(**BLUNT, velocity=velocity, **more)


SCENES = [
    # name, what it shows, crater stage, mass, velocity, exit depth, stages
    ("crater", "rest in the crater", 0, 2.0, 60.0, None, blunt(60.0)),
    ("tunnel", "rest in the tunnel", 0, 2.0, 300.0, None, blunt(300.0)),
    ("perforate", "exit at 135 m/s", 0, 2.0, 400.0, 0.18, blunt(400.0)),
    ("graze", "exit a millionth of the depth before rest", 0, 2.0, 400.0, 0.200771166635, blunt(400.0)),
    (
        "constant",
        "constant force in the tunnel, exit halfway to rest: error estimates vanish and steps jump over the end",
        0,
        2.0,
        300.0,
        0.128,
        blunt(300.0, inertia=0.0),
    ),
    ("jump", "the crater constant is given, the force jumps at k d", 0, 2.0, 300.0, None, blunt(300.0, c=5e6)),
    ("forrestal", "Forrestal 1994 shot 14, ogive", 0, 0.906, 277.0, None, concrete(**SHOT_14, velocity=277.0)),
    ("viscous", "p + s x + r V, underdamped, one stage", None, 2.0, 60.0, None, [stage(p=5e4, s=1e6, r=500.0)]),
    (
        "layers",
        "crater, hard layer, air gap, soft layer",
        None,
        2.0,
        400.0,
        None,
        [stage(s=1.1e7, end=0.1), stage(p=9e5, q=3.3, end=0.13), stage(end=0.2), stage(p=3e5, r=200.0, q=3.0)],
    ),
    (
        "driven",
        "a thrust against a stiff viscous spring: the scene where implicit methods pay",
        None,
        1.0,
        1.0,
        9.0,
        [stage(p=-1000.0, s=100.0, r=1000.0)],
    ),
]


def environment() -> str:
    """An interpreter with the pinned packages, made on first use."""
    folder = HERE.parent.parent / "target" / "peers-environment"
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not python.exists():
        print(f"setting up {folder}", file=sys.stderr)
        venv.create(folder, with_pip=True)
    files = [argument for name in REQUIREMENTS for argument in ("-r", str(PEERS / name))]
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *files], check=True)
    return str(python)


def depth_scale(mass, velocity, exit_depth, stages):
    """Depth that scales the absolute tolerance: first boundary, else the way to rest under the force at impact."""
    boundaries = [depth for depth in [stages[0]["end_m"], exit_depth] if depth]
    force = stages[0]["static_force_n"] + (stages[0]["viscosity_kg_s"] + stages[0]["drag_kg_m"] * velocity) * velocity
    return min(boundaries) if boundaries else 0.5 * mass * velocity**2 / abs(force)


def requests(rtol):
    for name, about, crater, mass, velocity, exit_depth, stages in SCENES:
        request = {
            "mass_kg": mass,
            "velocity_m_s": velocity,
            "exit_depth_m": exit_depth,
            "rtol": rtol,
            "atol": [rtol * depth_scale(mass, velocity, exit_depth, stages), rtol * velocity],
            "repeats": 1,
            "stages": stages,
        }
        yield {"scene": name, "about": about, "crater": crater, "request": request}


def ask(python, command, rtol):
    """The greeting of a program and its answers, in the order of the scenes."""
    flights = list(requests(rtol))
    lines = [{"hello": 1}] + [{"id": i, **flight["request"]} for i, flight in enumerate(flights)]
    peer = [python, "-B", str(PEERS / command[0]), *command[1:]]
    asked = "".join(json.dumps(line) + "\n" for line in lines)
    done = subprocess.run(peer, input=asked, capture_output=True, text=True, timeout=600, check=True)
    hello, *answers = [json.loads(line) for line in done.stdout.splitlines()]
    for i, (flight, answer) in enumerate(zip(flights, answers, strict=True)):
        if answer.pop("id") != i or answer["error"] is not None:
            raise SystemExit(f"{command}: {flight['scene']}: {answer}")
        # The time of one flight on one machine on one day is no reference for anything.
        answer.pop("wall_ns")
        answer.pop("error")
        flight["answer"] = answer
    return hello, flights


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", help="interpreter that has the packages; default: one in target/")
    python = parser.parse_args().python or environment()
    pip = [python, "-m", "pip", "freeze", "--disable-pip-version-check"]
    packages = subprocess.run(pip, capture_output=True, text=True, check=True).stdout.split()
    wanted = {line.split("==")[0] for name in REQUIREMENTS for line in (PEERS / name).read_text().split("\n") if "==" in line}
    for file, command, rtol in PROGRAMS:
        hello, flights = ask(python, command, rtol)
        version = subprocess.run([python, "--version"], capture_output=True, text=True, check=True).stdout.strip()
        recording = {
            "program": hello["name"],
            "version": hello["version"],
            "method": hello["method"],
            "rtol": rtol,
            "command": f"python3 verification/peers/{' '.join(command)}",
            "recipe": "python3 verification/references/record.py",
            "recorded": datetime.date.today().isoformat(),
            "platform": f"{platform.system()} {platform.machine()}, {version}",
            "packages": [package for package in packages if package.split("==")[0] in wanted],
            "flights": flights,
        }
        (HERE / file).write_text(json.dumps(recording, indent=1) + "\n")
        print(f"{file}: {len(flights)} flights", file=sys.stderr)


if __name__ == "__main__":
    main()
