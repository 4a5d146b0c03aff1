"""Solves scenes from their text to 25 digits and records the numbers: `python3 verification/references/exact.py`.

Needs mpmath (`pip install mpmath`), Python 3.11 or later, and nothing of the program. It reads each text as TOML, converts
every quantity by the definition of its unit as an exact fraction, resolves the scene by docs/theory.md, section 1, and
solves it with Taylor series at 50 digits. Each flight is solved again at 65 digits with more terms; where no stage has
viscosity, depths and velocities are also those of V^2(x) in closed form, and times those of a quadrature. All must agree to
30 digits. The critical velocity comes from the exit backwards in time, from rest there.

`exact.json` has one scene a line: its name, its text (null: verification/scenes/NAME.toml), its numbers under the field names of
`solve --json` and `critical --json`, joined by dots (a field that is null there is absent here), and the condition of those
numbers that magnify a relative error of the scene's own numbers more than ten times.

`units.json` has the SI value of each unit, computed from its definition.
"""

import json
import pathlib
import re
import sys
import tomllib
from decimal import Decimal
from fractions import Fraction as Fr

import mpmath
from mpmath import mp, mpf

HERE = pathlib.Path(__file__).resolve().parent
SCENES = HERE.parent / "scenes"

# ------------------------------------------------------------------------------------------------ units

PREFIXES = {
    "Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1,
    "d": -1, "c": -2, "m": -3, "µ": -6, "n": -9, "p": -12, "f": -15, "a": -18, "z": -21, "y": -24,
}  # fmt: skip
INCH = Fr(254, 10000)  # international yard and pound agreement, 1959
FOOT = 12 * INCH
POUND = Fr(45359237, 10**8)
GRAVITY = Fr(980665, 10**5)  # 3rd General Conference on Weights and Measures, 1901
LBF = POUND * GRAVITY
# Value in SI units, and the powers of kilogram, metre and second.
PREFIXED = {
    "g": (Fr(1, 1000), (1, 0, 0)),
    "m": (Fr(1), (0, 1, 0)),
    "s": (Fr(1), (0, 0, 1)),
    "N": (Fr(1), (1, 1, -2)),
    "Pa": (Fr(1), (1, -1, -2)),
    "J": (Fr(1), (1, 2, -2)),
    "eV": (Fr(1602176634, 10**28), (1, 2, -2)),
}
ATOMS = {
    "t": (Fr(1000), (1, 0, 0)),
    "lb": (POUND, (1, 0, 0)),
    "oz": (POUND / 16, (1, 0, 0)),
    "gr": (POUND / 7000, (1, 0, 0)),
    "slug": (LBF / FOOT, (1, 0, 0)),
    "in": (INCH, (0, 1, 0)),
    "ft": (FOOT, (0, 1, 0)),
    "yd": (3 * FOOT, (0, 1, 0)),
    "mi": (5280 * FOOT, (0, 1, 0)),
    "mil": (INCH / 1000, (0, 1, 0)),
    "min": (Fr(60), (0, 0, 1)),
    "h": (Fr(3600), (0, 0, 1)),
    "d": (Fr(86400), (0, 0, 1)),
    "L": (Fr(1, 1000), (0, 3, 0)),
    "l": (Fr(1, 1000), (0, 3, 0)),
    "bar": (Fr(10**5), (1, -1, -2)),
    "atm": (Fr(101325), (1, -1, -2)),
    "at": (GRAVITY * 10**4, (1, -1, -2)),
    "dyn": (Fr(1, 10**5), (1, 1, -2)),
    "gf": (GRAVITY / 1000, (1, 1, -2)),
    "kgf": (GRAVITY, (1, 1, -2)),
    "lbf": (LBF, (1, 1, -2)),
    "kip": (1000 * LBF, (1, 1, -2)),
    "pdl": (POUND * FOOT, (1, 1, -2)),
    "psi": (LBF / INCH**2, (1, -1, -2)),
    "ksi": (1000 * LBF / INCH**2, (1, -1, -2)),
    "psf": (LBF / FOOT**2, (1, -1, -2)),
    "pcf": (POUND / FOOT**3, (1, -3, 0)),
    "kn": (Fr(1852, 3600), (0, 1, -1)),
}
DIMENSIONS = {
    "mass": (1, 0, 0),
    "length": (0, 1, 0),
    "pressure": (1, -1, -2),
    "density": (1, -3, 0),
    "velocity": (0, 1, -1),
    "force": (1, 1, -2),
    "stiffness": (1, 0, -2),
    "viscosity": (1, 0, -1),
    "drag": (1, -1, 0),
    "time": (0, 0, 1),
    "energy": (1, 2, -2),
}


def atom(name):
    """Value and dimension of one unit, with a prefix or without."""
    if name in ATOMS:
        return ATOMS[name]
    name = {"um": "µm", "us": "µs"}.get(name, name).replace("μ", "µ")
    for base in sorted(PREFIXED, key=len, reverse=True):
        if name == base:
            return PREFIXED[base]
        if name.endswith(base) and name[: -len(base)] in PREFIXES:
            value, dimension = PREFIXED[base]
            return value * Fr(10) ** PREFIXES[name[: -len(base)]], dimension
    raise KeyError(name)


def unit(text):
    """Value and dimension of a unit such as `lbf s/ft`, `kg/m^3`, `N·s²/m²`."""
    value, dimension = Fr(1), (0, 0, 0)
    for part, sign in zip(text.split("/"), (1, -1), strict=False):
        for word in re.split(r"[\s·*]+", re.sub(r"\s*\^\s*", "^", part.strip())):
            name, power = re.fullmatch(r"(.*?)\^?([23²³]?)", word).groups()
            power = sign * {"": 1, "2": 2, "²": 2, "3": 3, "³": 3}[power]
            one, of = atom(name)
            value *= one**power
            dimension = tuple(a + power * b for a, b in zip(dimension, of, strict=True))
    return value, dimension


def quantity(given, dimension=None):
    """Exact SI value of a number of a scene file."""
    if not isinstance(given, str):
        return Fr(given)
    number, name = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(.*)", given).groups()
    value, of = unit(name.strip())
    if of != DIMENSIONS[dimension]:
        raise ValueError(f"{given} is no {dimension}")
    return Fr(Decimal(number)) * value


# ------------------------------------------------------------------------------------------------ from the text to numbers


def read(text):
    """The numbers of a scene file as exact fractions by path, and its words."""
    root = tomllib.loads(text, parse_float=Decimal)
    numbers, words = {}, {}

    def put(path, table, key, dimension=None):
        if key in table:
            numbers[path] = quantity(table[key], dimension)

    shot, target = root["projectile"], root.get("target", {})
    put("mass", shot, "mass", "mass")
    put("thickness", target, "thickness", "length")
    if "impact" in root:
        put("velocity", root["impact"], "velocity", "velocity")
    words["criterion"] = root.get("perforation", {}).get("criterion", "full-depth")
    stages = root.get("stage", [])
    words["stages"] = len(stages)
    for i, stage in enumerate(stages):
        put(f"stage{i}.p", stage, "static_force", "force")
        put(f"stage{i}.s", stage, "stiffness", "stiffness")
        put(f"stage{i}.r", stage, "viscosity", "viscosity")
        put(f"stage{i}.q", stage, "drag", "drag")
        put(f"stage{i}.end", stage, "end", "length")
    if stages:
        return numbers, words
    put("diameter", shot, "diameter", "length")
    nose = shot["nose"]
    words["nose"] = nose.get("shape", "factor")
    for key in ("factor", "caliber_radius_head", "length_ratio", "radius_ratio"):
        put("nose", nose, key)
    put("strength", target, "strength", "pressure")
    put("density", target, "density", "density")
    laws = root.get("resistance", {})
    for key in ("S", "B", "k"):
        put(key, laws, key)
    if laws.get("crater_stiffness", "continuous") != "continuous":
        put("c", laws, "crater_stiffness", "stiffness")
    layers = target.get("layer", [])
    words["layers"] = len(layers)
    for i, layer in enumerate(layers):
        put(f"layer{i}.thickness", layer, "thickness", "length")
        put(f"layer{i}.strength", layer, "strength", "pressure")
        put(f"layer{i}.density", layer, "density", "density")
        put(f"layer{i}.S", layer, "S")
        put(f"layer{i}.r", layer, "viscosity", "viscosity")
    return numbers, words


INF = mpf("inf")


class Stage:
    def __init__(self, p=0, s=0, r=0, q=0, end=INF):
        self.p, self.s, self.r, self.q, self.end = mpf(p), mpf(s), mpf(r), mpf(q), mpf(end)

    def force(self, x, v):
        return self.p + self.s * x + self.r * v + self.q * v * v


def nose_factor(shape, psi):
    """N* (docs/theory.md, section 1)."""
    if shape == "flat":
        return mpf(1)
    return {
        "factor": lambda: psi,
        "ogive": lambda: 1 / (3 * psi) - 1 / (24 * psi**2),
        "cone": lambda: 1 / (1 + 4 * psi**2),
        "spherical": lambda: 1 - 1 / (8 * psi**2),
    }[shape]()


def perforating_depth(h):
    """y = x_p/d at which H/d = h counts as perforated, the smaller where two fit (section 4)."""
    if h <= mpf("2.997945"):
        a, b = mpf("3.19"), mpf("0.718")
        return (a - mp.sqrt(a * a - 4 * b * h)) / (2 * b)
    return (h - mpf("1.32")) / mpf("1.24")


def eq15(h):
    """Eq. 15 over S: as printed, and with Eq. 11-12 at k = 2 and the relation itself."""
    if h <= 3:
        printed = mpf("0.196") * (mpf("2.222") - mp.sqrt(mpf("4.935") - mpf("1.393") * h)) ** 2
    elif h <= mpf("3.8"):
        printed = mpf("0.128") * (h - mpf("1.32")) ** 2
    else:
        printed = mpf("0.633") * (h - mpf("2.56"))
    y, k = perforating_depth(h), 2
    impact = mp.pi * y * y / (4 * k) if y <= k else mp.pi / 2 * (y - mpf(k) / 2)
    return printed, impact / 2


class Problem:
    """The equation of motion of a scene; its crater's constant may depend on the impact speed."""

    def __init__(self, numbers, words):
        self.n, self.words = numbers, words
        n = numbers
        self.mass = n["mass"]
        self.thickness = n.get("thickness")
        self.exit = self.thickness
        self.crater = None
        if words["stages"]:
            self.plain = False
            get = lambda i, key: n.get(f"stage{i}.{key}", mpf(0))
            self.stages = [
                Stage(*(get(i, key) for key in "psrq"), n.get(f"stage{i}.end", INF)) for i in range(words["stages"])
            ]
            return
        d = self.d = n["diameter"]
        self.area = mp.pi * d * d / 4
        self.nose = nose_factor(words["nose"], n.get("nose"))
        self.B, self.k = n.get("B", mpf(1)), n.get("k", mpf(2))
        self.plain = words["layers"] == 0
        crater_depth = self.k * d
        if self.plain:
            self.S = n["S"] if "S" in n else 72 / mp.sqrt(n["strength"] / 10**6)
            tunnels = [self.medium(n["strength"], n["density"], self.S, 0, INF)]
        else:
            tunnels, end = [], mpf(0)
            for i in range(words["layers"]):
                of = lambda key, i=i: n.get(f"layer{i}.{key}")
                fc, S = of("strength"), of("S") if of("S") is not None else n.get("S")
                if S is None:
                    S = 72 / mp.sqrt(fc / 10**6) if fc > 0 else mpf(0)
                end += of("thickness") if of("thickness") is not None else INF
                last = i + 1 == words["layers"]
                if end > crater_depth or last:
                    law = self.medium(fc, of("density"), S, of("r") or 0, INF if last else end)
                    tunnels.append(law)
            self.thickness = self.exit = end if end < INF else None
        self.P, self.Q = tunnels[0].p, tunnels[0].q
        self.stages = tunnels
        if self.k > 0:
            self.crater = 0
            self.stages = [Stage(end=crater_depth), *tunnels]
        if words["criterion"] == "ndrc" and self.exit is not None:
            self.exit = perforating_depth(self.exit / d) * d

    def medium(self, fc, rho, S, r, end):
        return Stage(self.area * S * fc, 0, r, self.area * self.nose * self.B * rho, end)

    def at(self, speed):
        """The stages at an impact speed."""
        if self.crater is not None:
            depth = self.stages[0].end
            c = self.n.get("c")
            if c is None:
                c = self.mass * (self.P + self.Q * speed**2) / (depth * (self.mass + depth * self.Q))
            self.stages[0].s = c
        return self.stages


# ------------------------------------------------------------------------------------------------ flights


def coefficients(law, mass, x, v, order):
    """Taylor coefficients of x and V in time; a negative mass runs time backwards."""
    xs, vs = [x], [v]
    for n in range(order):
        square = mpf(0)
        if law.q:
            half = sum((vs[k] * vs[n - k] for k in range((n + 1) // 2)), mpf(0))
            square = 2 * half + (vs[n // 2] ** 2 if n % 2 == 0 else 0)
        force = law.s * xs[n] + law.r * vs[n] + law.q * square + (law.p if n == 0 else 0)
        xs.append(vs[n] / (n + 1))
        vs.append(-force / mass / (n + 1))
    return xs, vs


def value(series, h):
    total = mpf(0)
    for c in reversed(series):
        total = total * h + c
    return total


def root(series, target, low, high):
    """The time at which a monotone series takes a value: bisection, then Newton's steps kept inside the bracket."""
    slope = [c * n for n, c in enumerate(series)][1:]
    sign = 1 if value(series, high) > value(series, low) else -1
    t = (low + high) / 2
    for _ in range(400):
        f = sign * (value(series, t) - target)
        if f > 0:
            high = t
        else:
            low = t
        d = sign * value(slope, t)
        new = t - f / d if d > 0 else (low + high) / 2
        if not low <= new <= high:
            new = (low + high) / 2
        if abs(new - t) <= abs(new) * mp.eps * 4:
            return new
        t = new
    return t


def step(law, mass, x, v, limit, scale, order):
    """A step that keeps the last terms below the working precision, and does not look far beyond the limit."""
    xs, vs = coefficients(law, mass, x, v, order)
    eps = mp.eps * scale
    h = INF
    for n in (order - 1, order):
        if vs[n]:
            h = min(h, (eps / abs(vs[n])) ** (mpf(1) / n))
        if xs[n] and x > 0:
            h = min(h, (mp.eps * x / abs(xs[n])) ** (mpf(1) / n))
    if law.s:
        # A quarter of an oscillation: a later rest is none.
        h = min(h, mpf("1.5") * mp.sqrt(mass / law.s))
    rate = abs(law.force(x, v) / mass)
    if v > 0 and limit < INF:
        h = min(h, mpf("1.5") * (limit - x) / v + mp.sqrt(2 * (limit - x) / rate if rate else 0))
    elif rate:
        h = min(h, 2 * max(v, scale / 100) / rate)
    return xs, vs, h


def fly(problem, speed, order):
    """Every event, the end and the exit margin of the flight at an impact speed."""
    stages, mass = problem.at(speed), problem.mass
    exit_depth = problem.exit if problem.exit is not None else INF
    t, x, v, events = mpf(0), mpf(0), speed, []
    least = INF
    margin_of = lambda w: None if exit_depth == INF or not speed else w / speed**2
    if exit_depth == 0:
        return dict(outcome="perforated", stage=0, t=t, x=x, v=v, events=[("exit", None, t, x, v)], margin=mpf(1))
    if speed == 0:
        kind = "stopped" if not problem.plain else "stopped-in-crater" if problem.crater is not None else "stopped-in-tunnel"
        return dict(outcome=kind, stage=0, t=t, x=x, v=v, events=[("rest", None, t, x, v)], margin=None)
    for index, law in enumerate(stages):
        limit = min(law.end, exit_depth)
        if limit <= x and index + 1 < len(stages) and limit < exit_depth:
            raise ValueError("an empty stage")
        for _ in range(200000):
            xs, vs, h = step(law, mass, x, v, limit, speed, order)
            if value(vs, h) < 0 or (v == 0):
                rest = root(vs, mpf(0), mpf(0), h)
                if value(xs, rest) < limit:
                    t, x, v = t + rest, value(xs, rest), mpf(0)
                    events.append(("rest", None, t, x, v))
                    where = "crater" if index == problem.crater else "tunnel"
                    w = beyond(problem, stages, index, x, INF)
                    return dict(
                        outcome=f"stopped-in-{where}" if problem.plain else "stopped",
                        stage=index, t=t, x=x, v=v, events=events, margin=margin_of(min(w, least)),
                    )  # fmt: skip
                h = rest
            if value(xs, h) >= limit:
                h = root(xs, limit, mpf(0), h)
                t, x, v = t + h, limit, value(vs, h)
                break
            t, x, v = t + h, value(xs, h), value(vs, h)
        else:
            raise ValueError("the flight does not end")
        if law.end <= exit_depth and index + 1 < len(stages):
            events.append(("crater-end", None, t, x, v) if index == problem.crater else ("stage-end", index, t, x, v))
        least = min(least, v * v)
        if limit == exit_depth:
            events.append(("exit", None, t, x, v))
            return dict(outcome="perforated", stage=index, t=t, x=x, v=v, events=events, margin=margin_of(least))
    raise ValueError("the flight leaves its last stage")


def w_after(law, mass, w, x0, x1):
    """V^2 at x1 from that at x0 without viscosity: the linear equation dW/dx = -2 (p + s x + q W)/M."""
    if law.q == 0:
        return w - (2 * law.p * (x1 - x0) + law.s * (x1**2 - x0**2)) / mass
    slope = -law.s / law.q
    level = -(law.p + mass * slope / 2) / law.q
    return level + slope * x1 + (w - level - slope * x0) * mp.exp(-2 * law.q * (x1 - x0) / mass)


def beyond(problem, stages, index, x, least):
    """Least W from rest at x over the stage ends ahead and the exit; by the static work where there is viscosity."""
    w, exit_depth = mpf(0), problem.exit if problem.exit is not None else INF
    if exit_depth == INF:
        return least
    for law in stages[index:]:
        to = max(min(law.end, exit_depth), x)
        if law.r > 0:
            w -= (2 * law.p * (to - x) + law.s * (to**2 - x**2)) / problem.mass
        else:
            w = w_after(law, problem.mass, w, x, to)
        least, x = min(least, w), to
        if law.end >= exit_depth:
            break
    return least


def proof_without_viscosity(problem, flight, speed):
    """The same flight from V^2(x) and quadratures; returns the largest relative difference."""
    stages, mass = problem.at(speed), problem.mass
    x, w, t, worst = mpf(0), speed**2, mpf(0), mpf(0)
    for kind, _, time, depth, v in flight["events"]:
        if kind == "exit" and depth == x and t > 0:
            continue
        law = next(law for law in stages if law.end > x)
        with mp.workdps(2 * mp.dps):
            here = lambda y, law=law, x=x, w=w: w_after(law, mass, w, x, y)
            if kind == "rest":
                # The nearest root of V^2(x).
                end = mpmath.findroot(here, depth, tol=mpf(10) ** (-3 * mp.dps // 2), verify=False)
                f = lambda u, end=end, here=here: 2 * u / mp.sqrt(here(end - u * u))
                span, w_end = mp.sqrt(end - x), mpf(0)
                cuts = [span * mpf(i) / 8 for i in range(9)]
            else:
                end, w_end = depth, here(depth)
                f = lambda y, here=here: 1 / mp.sqrt(here(y))
                # Towards the end V may almost vanish: intervals that shrink towards it.
                cuts = [end - (end - x) * mpf(2) ** -i for i in range(40)] + [end]
            taken = +mp.quad(f, cuts, method="gauss-legendre") if end > x else mpf(0)
        t, x, w = t + taken, end, w_end
        for ours, theirs, scale in ((t, time, time), (x, depth, depth), (mp.sqrt(w), v, speed)):
            if scale:
                worst = max(worst, abs(ours - theirs) / scale)
    return worst


def critical(problem, order):
    """The impact speed that just perforates: backwards in time from rest at each barrier; None without an exit."""
    if problem.exit is None:
        return None
    stages, mass, exit_depth, best = problem.at(mpf(0)), problem.mass, problem.exit, mpf(0)
    ends = [law.end for law in stages if law.end < exit_depth] + [exit_depth]
    depth = stages[0].end if problem.crater is not None else None
    for barrier in ends:
        if depth is not None and barrier <= depth:
            # W = V0^2 - c x^2/M with c as it is, or as it follows from V0.
            k, M, P, Q, c = depth, mass, problem.P, problem.Q, problem.n.get("c")
            x2 = barrier**2
            best = max(best, mp.sqrt(c * x2 / M if c is not None else x2 * P / (k * (M + k * Q) - x2 * Q)))
            continue
        index = next(i for i, law in enumerate(stages) if law.end >= barrier)
        x, v = barrier, mpf(0)
        scale = mp.sqrt(2 * max(abs(law.force(barrier, mpf(0))) for law in stages) * barrier / mass) or mpf(1)
        while index >= 0 and not (index == 0 and problem.crater is not None):
            law, start = stages[index], stages[index - 1].end if index else mpf(0)
            if v == 0 and law.force(x, v) <= 0:
                x = None
                break
            for _ in range(200000):
                # Time t = -tau: dx/dtau = -V, dV/dtau = F/M, that is the motion of y = -x.
                xs, vs = [x], [v]
                for n in range(order):
                    square = sum((vs[k] * vs[n - k] for k in range(n + 1)), mpf(0)) if law.q else 0
                    force = law.s * xs[n] + law.r * vs[n] + law.q * square + (law.p if n == 0 else 0)
                    xs.append(-vs[n] / (n + 1))
                    vs.append(force / mass / (n + 1))
                h = INF
                for n in (order - 1, order):
                    if vs[n]:
                        h = min(h, (mp.eps * scale / abs(vs[n])) ** (mpf(1) / n))
                rate = abs(law.force(x, v) / mass)
                near = mpf("1.5") * mp.sqrt(mass / law.s) if law.s else INF
                if v:
                    near = min(near, mpf("1.5") * (x - start) / v)
                if rate:
                    near = min(near, mpf("1.5") * mp.sqrt(2 * (x - start) / rate))
                h = min(h, near)
                if value(vs, h) < 0:
                    x = None
                    break
                if value(xs, h) <= start:
                    h = root(xs, start, mpf(0), h)
                    x, v = start, value(vs, h)
                    break
                x, v = value(xs, h), value(vs, h)
            else:
                raise ValueError("no end backwards")
            if x is None:
                break
            index -= 1
        if x is None:
            continue
        if index == 0 and problem.crater is not None:
            k, M, c = depth, mass, problem.n.get("c")
            w = v * v
            v = mp.sqrt(w + c * k * k / M if c is not None else (w * (M + k * problem.Q) + k * problem.P) / M)
        best = max(best, v)
    return best


# ------------------------------------------------------------------------------------------------ what is recorded


def answers(numbers, words, order):
    """Every number that the scene gives, by the field names of `solve --json` and `critical --json`; and the outcome."""
    problem = Problem(numbers, words)
    n, out, word = numbers, {}, {}
    speed = n.get("velocity")
    scene = lambda name, number: out.__setitem__(f"scene.{name}", number)
    scene("mass_kg", problem.mass)
    if problem.thickness is not None:
        scene("thickness_m", problem.thickness)
        scene("exit_depth_m", problem.exit)
    if not words["stages"]:
        scene("diameter_m", problem.d)
        scene("nose_factor", problem.nose)
        scene("B", problem.B)
        scene("k", problem.k)
        if problem.plain:
            scene("strength_pa", n["strength"])
            scene("density_kg_m3", n["density"])
            scene("S", problem.S)
            scene("static_force_n", problem.P)
            scene("drag_kg_m", problem.Q)
            if problem.thickness is not None:
                out["groups.H_over_d"] = problem.thickness / problem.d
            if problem.Q:
                out["groups.N"] = problem.mass / (problem.nose * problem.B * n["density"] * problem.d**3)
    flight = None
    if speed is not None:
        scene("velocity_m_s", speed)
        flight = fly(problem, speed, order)
        if problem.crater is not None:
            scene("crater_stiffness_n_m", problem.stages[0].s)
        elif "c" in n:
            scene("crater_stiffness_n_m", n["c"])
        for i, law in enumerate(problem.stages):
            for name, number in (
                ("static_force_n", law.p),
                ("stiffness_n_m", law.s),
                ("viscosity_kg_s", law.r),
                ("drag_kg_m", law.q),
            ):
                scene(f"stages.{i}.{name}", number)
            if i + 1 < len(problem.stages):
                scene(f"stages.{i}.end_m", law.end)
        if not words["stages"]:
            if problem.plain:
                out["groups.I"] = problem.mass * speed**2 / (problem.S * n["strength"] * problem.d**3)
            out["groups.X_over_d"] = flight["x"] / problem.d
        word["outcome"] = flight["outcome"]
        out["stage"] = mpf(flight["stage"])
        out["depth_m"], out["time_s"], out["velocity_m_s"] = flight["x"], flight["t"], flight["v"]
        if flight["margin"] is not None:
            out["exit_margin"] = flight["margin"]
        for i, (kind, stage, t, x, v) in enumerate(flight["events"]):
            word[f"events.{i}.event"] = kind
            if stage is not None:
                out[f"events.{i}.stage"] = mpf(stage)
            out[f"events.{i}.time_s"], out[f"events.{i}.depth_m"], out[f"events.{i}.velocity_m_s"] = t, x, v
    vc = critical(problem, order)
    if vc is not None:
        out["critical_velocity_m_s"] = vc
        out["critical_energy_j"] = problem.mass * vc**2 / 2
        if not words["stages"] and problem.plain:
            out["dimensionless_energy"] = out["critical_energy_j"] / (problem.d**3 * n["strength"])
            printed, unrounded = eq15(problem.thickness / problem.d)
            out["eq15.printed"], out["eq15.unrounded"] = problem.S * printed, problem.S * unrounded
    return out, word, problem, flight


def decimals(numbers):
    return {key: mpf(x.numerator) / x.denominator for key, x in numbers.items()}


def record(name, text, digits=25):
    """One line of the file."""
    exact, words = read(text if text is not None else (SCENES / f"{name}.toml").read_text())
    mp.dps = 65
    second, word2, _, _ = answers(decimals(exact), words, 90)
    mp.dps = 50
    first, word, problem, flight = answers(decimals(exact), words, 62)
    assert word == word2 and first.keys() == second.keys(), name
    for key, number in first.items():
        scale = max(abs(number), first.get("scene.velocity_m_s", 0) if "velocity" in key else 0)
        assert abs(number - second[key]) <= mpf(10) ** -30 * scale, (name, key, number, second[key])
    if flight and flight["x"] > 0 and all(law.r == 0 for law in problem.stages):
        mp.dps = 45
        worst = proof_without_viscosity(problem, flight, problem.n["velocity"])
        assert worst < mpf(10) ** -30, (name, mp.nstr(worst, 3))
        mp.dps = 50
    if first.get("critical_velocity_m_s"):
        vc, tiny = first["critical_velocity_m_s"], mpf(10) ** -25
        for sign, outcome in ((1, True), (-1, False)):
            ends = fly(problem, vc * (1 + sign * tiny), 62)["outcome"] == "perforated"
            assert ends == outcome, (name, "V_c")
    # Relative condition: the sum over the numbers of the scene of |d ln answer/d ln number|.
    mp.dps = 40
    condition = dict.fromkeys(first, mpf(0))
    base = answers(decimals(exact), words, 50)[0]
    for key, number in exact.items():
        if number == 0:
            continue
        moved = decimals(exact) | {key: decimals(exact)[key] * (1 + mpf(10) ** -14)}
        try:
            there = answers(moved, words, 50)[0]
        except (KeyError, ValueError):
            continue
        for key, before in base.items():
            if before and key in there:
                condition[key] += abs(there[key] / before - 1) * 10**14
    large = {key: mp.nstr(mp.ceil(c), 3) for key, c in condition.items() if 10 < c < 10**10}
    show = lambda x: mp.nstr(x, digits, min_fixed=-4, max_fixed=9, strip_zeros=True).removesuffix(".0")
    line = {"name": name, "text": text, "words": word, "numbers": {key: show(x) for key, x in second.items()}}
    if large:
        line["condition"] = {key: str(int(mpf(c))) for key, c in large.items()}
    return line


SHIPPED = sorted(path.stem for path in SCENES.glob("*.toml"))


def main():
    lines = [record(name, None) for name in SHIPPED]
    text = {"recipe": "python3 verification/references/exact.py", "scenes": []}
    body = ",\n".join(json.dumps(line, ensure_ascii=False, separators=(",", ":")) for line in lines)
    (HERE / "exact.json").write_text(json.dumps(text)[:-2] + "\n" + body + "\n]}\n")


if __name__ == "__main__":
    main()
