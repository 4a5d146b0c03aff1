"""Records what the peers answer, with provenance: `python3 verification/references/record.py`.

Sets up a virtual environment with the pinned packages (or takes `--python`, an interpreter that has them), asks every
program below for every scene below, and writes one file a program beside this script. `penetrode verify` compares
with these files by default and asks the programs themselves with `--live-peers`.
"""

import argparse
import datetime
import json
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


# Scenes of `verification/scenes` that every program is asked for.
SCENES = [
    "crater",
    "tunnel",
    "perforate",
    "graze",
    "forrestal-1994-shot-14",
    "paper-slab",
    "perforate-no-drag",
    "jump",
    "viscous",
    "layered",
    "stiff",
]


def resolved(name):
    """The scene as the program resolves it into stages: mass, velocity, exit depth, stages, and its title."""
    command = ["cargo", "run", "--quiet", "--", "solve", f"verification/scenes/{name}.toml", "--json"]
    done = subprocess.run(command, cwd=HERE.parent.parent, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["scene"]


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
    for name in SCENES:
        scene = resolved(name)
        mass, velocity, exit_depth = scene["mass_kg"], scene["velocity_m_s"], scene["exit_depth_m"]
        request = {
            "mass_kg": mass,
            "velocity_m_s": velocity,
            "exit_depth_m": exit_depth,
            "rtol": rtol,
            "atol": [rtol * depth_scale(mass, velocity, exit_depth, scene["stages"]), rtol * velocity],
            "repeats": 1,
            "stages": scene["stages"],
        }
        crater = 0 if scene["k"] else None
        yield {"scene": name, "about": scene["title"], "crater": crater, "request": request}


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
