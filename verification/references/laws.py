"""Solves the scenes with a law of their own to 25 digits: `python3 verification/references/laws.py` writes `laws.json`.

Needs mpmath, Python 3.11 or later, and nothing of the program; units are read by `exact.py`, which also says what a line of
the file holds. A force is evaluated as it stands in the scene. No equation of motion is integrated:

- F of V alone: `x = M ∫ V dV/F` and `t = M ∫ dV/F`, from the speed of the end to that of the impact.
- F of V as a table: as the first, over each of its pieces alone.
- `F = A(x) + Q V²`: `W(x) = e^(-2 Q x/M) (W0 - (2/M) ∫ A e^(2 Q x/M) dx)`, and `t = ∫ dx/sqrt(W)`.
- Stages of F of V alone that end at a speed or on a condition g(x, V) = 0: as the first, with x over V; the first zero of g over V.
- `F = C(x) V^n`, n < 1: `V^(2-n) = V0^(2-n) - ((2-n)/M) ∫ C dx`, and `t = ∫ dx/V`.

Each is done with 40 digits and again with 55 and other nodes; both must agree to 30 digits. Depths of Robins and Euler, Poncelet,
Resal, Petry and NDRC, and the flight of Forrestal, must also be those of their formulas, as published.
"""

import json
import re
import tomllib
from decimal import Decimal
from fractions import Fraction as Fr

import exact
from mpmath import mp, mpf

HERE, SCENES = exact.HERE, exact.SCENES
# How each is solved; speeds at which F has a kink or a pole is near, or depths.
LAWS = {
    "robins-euler": ("speed", []),
    "poncelet": ("speed", []),
    "resal": ("speed", []),
    "power": ("speed", []),
    "forrestal-1994": ("depth", []),
    "frew": ("depth", []),
    "cavity-expansion": ("speed", []),
    "vitman-stepanov": ("speed", []),
    "rosenberg-dekel": ("speed", ["450"]),
    "petry": ("speed", []),
    "ndrc": ("power", []),
    "ceb-rate": ("speed", ["1.5e-6", "1e-4", "1e-2", "1.5"]),
    "johnson-cook-rate": ("speed", ["0.05", "1", "10"]),
    "free-surface": ("depth", ["0.05", "0.1"]),
    "allen": ("ends", []),
    "plug": ("ends", []),
    "two-layers": ("depth", ["0.06", "0.09", "0.11", "0.14"]),
    "speed-table": ("speed", ["20", "60", "120", "200", "300"]),
}

# Texts of the same force that is not built of the four terms, and so stays a law: units that are known to some digits, in an
# expression.
TWINS = {"law of Petry by a root": ("petry", "(V^2 + 215000*v1^2)", "sqrt(V^2 + 215000*v1^2)^2")}


def number(given):
    """SI value of a number or a quantity of any dimension."""
    if not isinstance(given, str):
        return ratio(Fr(given))
    value, name = re.fullmatch(r"([-+\d.eE]+) (.*)", given).groups()
    above, _, below = name.partition("/")
    scale = exact.unit(above)[0] if above.strip() else Fr(1)
    return ratio(Fr(Decimal(value)) * scale / (exact.unit(below)[0] if below else 1))


def ratio(value):
    return mpf(value.numerator) / value.denominator


def table(force):
    """F of V, linear between the rows of a table in m/s and kN."""
    lines = [line.split(",") for line in (SCENES / force["table"]).read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == [force["V"], force["force"]] == ["speed_m_s", "force_kN"]
    rows = [[mpf(speed), 1000 * mpf(load)] for speed, load in lines[1:]]

    def at(x, v):
        (a, f), (b, g) = next((one, other) for one, other in zip(rows, rows[1:]) if v <= other[0])
        return f + (g - f) * (v - a) / (b - a)

    return at


class Scene:
    def __init__(self, name):
        root = tomllib.loads((SCENES / f"law-{name}.toml").read_text(), parse_float=Decimal)
        self.name, self.title = name, root["title"]
        self.mass, self.speed = number(root["projectile"]["mass"]), number(root["impact"]["velocity"])
        self.thickness = number(root["target"]["thickness"]) if "target" in root else None
        self.known = {key: number(value) for key, value in root.get("parameters", {}).items()}
        known = {name: getattr(mp, name) for name in ("sqrt", "exp", "log", "tanh", "pi")} | {"max": max} | self.known
        self.forces, self.ends = [], []
        self.stages = root["stage"]
        for stage in root["stage"]:
            force = stage.get("force", "0")
            self.forces.append(table(force) if isinstance(force, dict) else self.function(force, known))
            self.ends.append(number(stage["end"]) if "end" in stage else mp.inf)
        left, right = zip(*(stage.get("until", "1 = 0").split("=") for stage in root["stage"]))
        self.until = [self.function(f"({a}) - ({b})", known) for a, b in zip(left, right)]
        self.kind, marks = LAWS[name]
        self.marks = [mpf(mark) for mark in marks]
        self.far = self.thickness if self.thickness is not None else mp.inf

    def function(self, text, known):
        # Every number is the decimal that stands there: 1/3 of two floats has 16 digits.
        text = re.sub(r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?)", r"mpf('\1')", text.replace("^", "**").strip())
        code = compile(text, self.name, "eval")
        return lambda x, V: eval(code, known | {"mpf": mpf}, {"x": mpf(x), "V": mpf(V)})

    def coefficients(self, stage):
        """p, s, r, q of a force that is p + s x + r V + q V², with what a stage may have, in a scene whose stages end at depths."""
        if any("until" in other or "end_velocity" in other for other in self.stages):
            return None
        force, far = self.forces[stage], 2 * self.speed
        try:
            p, fast, back = force(0, 0), force(0, far), force(0, -far)
            s, r, q = force(1, 0) - p, (fast - back) / (2 * far), ((fast + back) / 2 - p) / far**2
            size = abs(p) + abs(s) + abs(fast)
            p, s, r, q = (mpf(0) if abs(term) < mpf(10) ** -32 * size else term for term in (p, s, r, q))
            is_one = all(
                abs(force(x, v) - (p + s * x + r * v + q * v * v)) <= mpf(10) ** -32 * size * (1 + x)
                for x, v in ((mpf("0.37"), self.speed), (mpf("0.0213"), self.speed / 3), (mpf("1.9"), mpf("0.03")))
            )
        except (StopIteration, TypeError, ValueError, ZeroDivisionError):
            return None
        rests = p != 0 or s != 0
        return (p, s, r, q) if is_one and rests and min(s, r, q) >= 0 else None

    # ---- F of V alone

    def by_speed(self, power, low, high):
        """M times the integral of V^power/F."""
        nodes = [low, *(mark for mark in self.marks if low < mark < high), high]
        return self.mass * mp.quad(lambda v: v**power / self.forces[0](0, v), nodes)

    # ---- F = A(x) + Q V², and C(x) V^n

    def nodes(self, low, high):
        return [low, *(mark for mark in self.marks if low < mark < high), high]

    def left(self, stage, start, energy, x):
        """W at x from `energy` at `start`; for a power of V, V^(2-n)."""
        force = self.forces[stage]
        if self.kind == "power":
            n = mpf(1) / 5
            return energy - (2 - n) / self.mass * mp.quad(lambda s: force(s, 1), [start, x])
        k = 2 * (force(start, 1) - force(start, 0)) / self.mass
        work = mp.quad(lambda s: force(s, 0) * mp.exp(k * s), self.nodes(start, x), method="gauss-legendre")
        return mp.exp(-k * x) * (energy * mp.exp(k * start) - 2 / self.mass * work)

    def power(self):
        return mpf(5) / 9 if self.kind == "power" else mpf(1) / 2

    def by_depth(self):
        events, time, start, energy = [], mpf(0), mpf(0), self.speed ** (1 / self.power())
        for stage, end in enumerate(self.ends):
            end = min(end, self.far)
            left = lambda x: self.left(stage, start, energy, x)
            if end < mp.inf and left(end) > 0:
                time += mp.quad(lambda x: left(x) ** -self.power(), self.nodes(start, end), method="gauss-legendre")
                energy, start = left(end), end
                events.append(("exit" if end == self.far else "stage-end", stage, time, end, energy ** self.power()))
                if end == self.far:
                    break
                continue
            high = start + mpf("0.01")
            while left(high) > 0:
                high += mpf("0.01")
            X = mp.findroot(left, (high - mpf("0.01"), high), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 15))
            # x = X - (X - start) u^m, so that dx/V is smooth in u.
            if self.kind == "power":
                # C is constant here, and V^(2-n) falls evenly to zero.
                time += (X - start) / energy ** self.power() / (1 - self.power())
            else:
                marks = sorted(mp.sqrt((X - mark) / (X - start)) for mark in self.nodes(start, X))
                rate = lambda u: 2 * (X - start) * u / mp.sqrt(left(X - (X - start) * u * u))
                time += mp.quad(rate, marks, method="gauss-legendre")
            events.append(("rest", stage, time, X, mpf(0)))
            break
        return events

    # ---- stages of F of V alone that end at speeds or on conditions

    def slowed(self, stage, mass, power, low, high):
        return mass * mp.quad(lambda v: v**power / self.forces[stage](0, v), [low, high])

    def by_ends(self, speed, far):
        events, time, depth, mass = [], mpf(0), mpf(0), self.mass
        for index, stage in enumerate(self.stages):
            if self.forces[index](0, 1) == 0:
                time += (far - depth) / speed
                return events + [("exit", index, time, far, speed)]
            start, fast, moving = depth, speed, mass
            at = lambda v: start + self.slowed(index, moving, 1, v, fast)
            root = lambda g, low, high: mp.findroot(g, (low, high), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 15))
            slow = mpf(0)
            if "end_velocity" in stage:
                slow = min(fast, number(stage["end_velocity"]))
            elif "until" in stage:
                g = lambda v: self.until[index](at(v), v)
                places = [fast * (1 - mpf(i) / 64) for i in range(65)]
                pair = next((pair for pair in zip(places, places[1:]) if g(pair[0]) * g(pair[1]) <= 0), None)
                slow = root(g, pair[1], pair[0]) if pair else slow
            if at(slow) > far:
                slow = root(lambda v: at(v) - far, slow, fast)
                return events + [("exit", index, time + self.slowed(index, moving, 0, slow, fast), far, slow)]
            time, depth, speed = time + self.slowed(index, moving, 0, slow, fast), at(slow), slow
            if slow == 0:
                return events + [("rest", index, time, depth, speed)]
            events.append(("stage-end", index, time, depth, speed))
            mass += number(stage.get("add_mass", 0))
            speed *= moving / mass

    def fly(self):
        """Events: kind, stage, time, depth, velocity."""
        if self.kind == "ends":
            return self.by_ends(self.speed, self.far)
        if self.kind != "speed":
            return self.by_depth()
        if self.thickness is None:
            return [("rest", 0, self.by_speed(0, 0, self.speed), self.by_speed(1, 0, self.speed), mpf(0))]
        low, high = mpf(1), self.speed
        way = lambda v: self.by_speed(1, v, self.speed) - self.thickness
        v = mp.findroot(way, (low, high), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 15))
        return [("exit", 0, self.by_speed(0, v, self.speed), self.thickness, v)]

    def critical(self):
        tol = mpf(10) ** (-2 * mp.dps + 15)
        if self.name == "plug":
            # The slowest that leaves comes to rest where its condition is met.
            rests = lambda v: self.until[0](self.slowed(0, self.mass, 1, 0, v), 0)
            speed = mp.findroot(rests, (1, self.speed), solver="anderson", tol=tol)
            for share, kind in ((1 - mpf(10) ** -6, "rest"), (1 + mpf(10) ** -6, "exit")):
                assert self.by_ends(share * speed, self.far)[-1][0] == kind
            return speed
        if self.kind == "ends":
            last = lambda v: self.by_ends(v, mp.inf)[-1][3] - self.thickness
            return mp.findroot(last, (1, self.speed), solver="anderson", tol=tol)
        if self.kind == "speed":
            way = lambda v: self.by_speed(1, 0, v) - self.thickness
            return mp.findroot(way, (1, self.speed), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 15))
        force = self.forces[0]
        k = 2 * (force(0, 1) - force(0, 0)) / self.mass
        work = mp.quad(lambda s: force(s, 0) * mp.exp(k * s), self.nodes(0, self.far), method="gauss-legendre")
        return mp.sqrt(2 / self.mass * work)

    def formula(self):
        """Depth of rest as published, where it is; for Resal V_c."""
        p, M, V = self.known, self.mass, self.speed
        match self.name:
            case "robins-euler":
                return M * V**2 / (2 * p["P"])
            case "poncelet":
                return M / (2 * p["A"] * p["b"]) * mp.log(1 + p["b"] * V**2 / p["a"])
            case "resal":
                return p["a"] / p["b"] * (mp.exp(p["b"] * p["A"] * self.thickness / M) - 1)
            case "petry":
                return p["K"] * M * p["g"] / p["A"] * mp.log10(1 + V**2 / (215000 * p["v1"] ** 2))
            case "ndrc":
                # The expression has the numbers 0.2 and 1.8 in 64 bits.
                G = p["K"] * p["N"] * M / (p["d"] * mp.sqrt(p["fc"])) * (V / p["d"]) ** mpf("1.8")
                return p["d"] * (G + 1) if G > 1 else 2 * p["d"] * mp.sqrt(G)
            case "forrestal-1994":
                L = 2 * p["d"]
                P, Q = (mp.pi / 4 * p["d"] ** 2 * f for f in (p["S"] * p["fc"], p["N"] * p["rho"]))
                c = M * (P + Q * V**2) / (L * (M + L * Q))
                return L + M / (2 * Q) * mp.log(1 + Q * (V**2 - c * L**2 / M) / P)
        return None


def solved(name):
    scene = Scene(name)
    events = scene.fly()
    numbers = {"scene.mass_kg": scene.mass}
    words = {"scene.title": scene.title}
    if scene.thickness is not None:
        numbers |= {"scene.thickness_m": scene.thickness, "scene.exit_depth_m": scene.thickness}
    numbers["scene.velocity_m_s"] = scene.speed
    for i, end in enumerate(scene.ends):
        if end < mp.inf:
            numbers[f"scene.stages.{i}.end_m"] = end
        of = scene.coefficients(i)
        if of is not None:
            names = ("static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m")
            numbers |= {f"scene.stages.{i}.{key}": value for key, value in zip(names, of)}
    kind, stage, time, depth, velocity = events[-1]
    words["outcome"] = {"exit": "perforated", "rest": "stopped"}[kind]
    numbers |= {"stage": mpf(stage), "depth_m": depth, "time_s": time, "velocity_m_s": velocity}
    if kind == "exit":
        numbers["exit_margin"] = (velocity / scene.speed) ** 2
    for i, (kind, stage, time, depth, velocity) in enumerate(events):
        words[f"events.{i}.event"] = kind
        if kind == "stage-end":
            numbers[f"events.{i}.stage"] = mpf(stage)
        numbers |= {f"events.{i}.time_s": time, f"events.{i}.depth_m": depth, f"events.{i}.velocity_m_s": velocity}
    if scene.thickness is not None:
        speed = scene.critical()
        numbers |= {"critical_velocity_m_s": speed, "critical_energy_j": scene.mass * speed**2 / 2}
    expected = scene.formula()
    if expected is not None:
        ours = numbers["critical_velocity_m_s" if name == "resal" else "depth_m"]
        # The numbers of an expression are those nearest in 64 bits.
        assert abs(ours / expected - 1) < (mpf(10) ** -15 if name == "ndrc" else mpf(10) ** -30), (name, ours, expected)
    return words, numbers


def record(name):
    answers = []
    for mp.dps in (40, 55):
        answers.append(solved(name))
    (words, coarse), (_, fine) = answers
    for key, value in fine.items():
        assert abs(coarse[key] - value) <= mpf(10) ** -30 * abs(value), (name, key, coarse[key], value)
    texts = {key: mp.nstr(value, 25, min_fixed=-4, max_fixed=9).removesuffix(".0") for key, value in fine.items()}
    return {"name": f"law-{name}", "text": None, "words": words, "numbers": texts}


def twin(name):
    """The record of a shipped law whose text has another expression of the same force."""
    law, right, other = TWINS[name]
    text = (SCENES / f"law-{law}.toml").read_text()
    assert text.count(right) == 1, right
    known = record(law)
    terms = ("static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m")
    numbers = {key: value for key, value in known["numbers"].items() if key.rsplit(".")[-1] not in terms}
    return known | {"name": name, "text": text.replace(right, other), "numbers": numbers}


if __name__ == "__main__":
    records = [record(name) for name in LAWS] + [twin(name) for name in TWINS]
    lines = ",\n".join(json.dumps(one, ensure_ascii=False, separators=(",", ":")) for one in records)
    (HERE / "laws.json").write_text(f'{{"recipe": "python3 verification/references/laws.py", "scenes": [\n{lines}\n]}}\n')
