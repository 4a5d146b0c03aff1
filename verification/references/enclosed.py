"""Second opinion on enclosures: `python3 verification/references/enclosed.py` writes `enclosed.json`.

Needs python-flint 0.9.0 and mpmath (`pip install python-flint==0.9.0 mpmath`), Python 3.11 or later, and nothing of the program. Where
F is of V alone and above zero, depth and time over a stage are integrals, and FLINT encloses these in balls (`acb.integral`):

    x = M ∫ V dV/F,   t = M ∫ dV/F      from the speed at the end of the stage to that at its start

A stage that ends at a depth ends at the speed at which x is that depth: halved until the sign of the difference is no longer
proved. `max` stays what it is at its kinks, and a power of V at V = 0. Every number of a text is the fraction that stands
there; units are read by `exact.py`.

With `--capd PROGRAM`, the flights of benches/peers/capd are asked for and written to `capd.json` instead. They have stages with
stiffness too; coefficients that a scene leaves to its materials are those of `exact.py` in 50 digits, rounded outwards to f64.

A line of a file is a scene, as in `exact.json` (null: verification/scenes/NAME.toml); every number of an event is two decimals, low and
high. Texts of the record have numbers that are both decimals and f64.
"""

import argparse
import ast
import json
import pathlib
import random
import re
import subprocess
import tomllib
from decimal import Decimal
from fractions import Fraction as Fr
from math import inf, nextafter

import exact
import flint
from flint import acb, arb, fmpq
from mpmath import mp

HERE, SCENES = exact.HERE, exact.SCENES
FLINT = "0.9.0"
flint.ctx.prec = 200
# Digits of what is written; the program reads at most 38.
DIGITS = 36

LAWS = [
    "law-robins-euler", "law-poncelet", "law-resal", "law-power", "law-cavity-expansion", "law-vitman-stepanov", "law-rosenberg-dekel",
    "law-petry", "law-ceb-rate", "law-johnson-cook-rate", "law-speed-table", "law-allen", "constant-force",
]  # fmt: skip
FLIGHTS = [
    "crater", "tunnel", "perforate", "graze", "stiff", "spring-and-drag", "paper-slab", "jump", "jump-perforate", "loaded-spring",
    "constant-force", "perforate-no-drag", "tunnel-no-drag", "forrestal-1994-shot-14", "layered", "viscous", "overdamped",
]  # fmt: skip

# ------------------------------------------------------------------------------------------------ numbers


def ball(value):
    """A fraction as a ball."""
    value = Fr(value)
    return arb(fmpq(value.numerator, value.denominator))


def fraction(point):
    """The exact value of a ball without radius."""
    man, exp = point.man_exp()
    return Fr(int(man)) * Fr(2) ** int(exp)


def decimal(value, up):
    """`value` with `DIGITS` digits, rounded up or down."""
    if value == 0:
        return "0"
    power = DIGITS - len(str(abs(value.numerator) // value.denominator or 1))
    while abs(value) * Fr(10) ** power < 10 ** (DIGITS - 1):
        power += 1
    while abs(value) * Fr(10) ** power >= 10**DIGITS:
        power -= 1
    scaled = value * Fr(10) ** power
    digits = str(-(-scaled // 1) if up else scaled // 1)
    return f"{digits[0]}.{digits[1:]}".rstrip("0").rstrip(".") + f"e{len(digits) - 1 - power}"


def ends(value):
    """A ball, or a fraction, as two decimals."""
    if isinstance(value, Fr):
        return [decimal(value, False), decimal(value, True)]
    assert value.is_finite(), value
    return [decimal(fraction(value.lower()), False), decimal(fraction(value.upper()), True)]


# ------------------------------------------------------------------------------------------------ forces


class Powers(ast.NodeTransformer):
    """`a ** b` as a call, which must know whether it is asked for an analytic function."""

    def visit_BinOp(self, node):
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        return ast.Call(ast.Name("power", ast.Load()), [node.left, node.right], [])


def power(base, exponent, analytic):
    if not analytic and base.imag == 0 and base.real.contains(0) and exponent.real > 0:
        # V >= 0 and the exponent is above zero: the power lies between zero and that of the upper end.
        high = arb(base.real.upper()) ** exponent.real
        return acb((high / 2).union(arb(0)).union(high))
    return base.pow(exponent, analytic=analytic)


def law(text, parameters):
    """F as a function of V and of whether it must be analytic there."""
    text = re.sub(r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?)", r"N('\1')", text.replace("^", "**").strip())
    code = compile(ast.fix_missing_locations(Powers().visit(ast.parse(text, mode="eval"))), text, "eval")
    known = {name: acb(ball(value)) for name, value in parameters.items()} | {"N": lambda digits: acb(ball(Fr(digits)))}
    known["pi"] = acb.pi()

    def at(V, analytic):
        now = {
            "V": V,
            "power": lambda a, b: power(a, b, analytic),
            "max": lambda a, b: a.real_max(b, analytic=analytic),
            "sqrt": lambda a: a.sqrt(analytic=analytic),
            "log": lambda a: a.log(analytic=analytic),
            "exp": lambda a: a.exp(),
            "tanh": lambda a: a.tanh(),
        }
        return eval(code, known | now)

    return at


def polynomial(p, r, q):
    p, r, q = (acb(ball(value)) for value in (p, r, q))
    return lambda V, analytic: p + V * (r + q * V)


def tabulated(force):
    """F of V, linear between the rows of a table in m/s and kN, and where its pieces meet."""
    lines = [line.split(",") for line in (SCENES / force["table"]).read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == [force["V"], force["force"]] == ["speed_m_s", "force_kN"]
    rows = [(Fr(speed), 1000 * Fr(load)) for speed, load in lines[1:]]
    pieces = []
    for (a, f), (b, g) in zip(rows, rows[1:]):
        r = (g - f) / (b - a)
        pieces.append((a, b, polynomial(f - r * a, r, 0)))
    return pieces


# ------------------------------------------------------------------------------------------------ flights


class Scene:
    """Mass, speed, far side and stages; every number a fraction. A stage is its pieces over V, its end and its end in V."""

    def __init__(self, text):
        root = tomllib.loads(text, parse_float=Decimal)
        si = lambda value: exact.quantity(value) if not isinstance(value, str) else self.si(value)
        self.mass, self.speed = si(root["projectile"]["mass"]), si(root["impact"]["velocity"])
        self.far = si(root["target"]["thickness"]) if "target" in root else None
        parameters = {name: si(value) for name, value in root.get("parameters", {}).items()}
        self.stages = []
        for stage in root["stage"]:
            force = stage.get("force")
            if isinstance(force, dict):
                pieces = tabulated(force)
            elif force is not None:
                pieces = [(Fr(0), inf, law(force, parameters))]
            else:
                assert "stiffness" not in stage or si(stage["stiffness"]) == 0
                p, r, q = (si(stage.get(key, 0)) for key in ("static_force", "viscosity", "drag"))
                pieces = [(Fr(0), inf, polynomial(p, r, q))]
            end, slow = (si(stage[key]) if key in stage else None for key in ("end", "end_velocity"))
            self.stages.append((pieces, end, slow))

    @staticmethod
    def si(text):
        value, name = re.fullmatch(r"([-+\d.eE]+) (.*)", text).groups()
        above, _, below = name.partition("/")
        scale = exact.unit(above)[0] if above.strip() else Fr(1)
        return Fr(Decimal(value)) * scale / (exact.unit(below)[0] if below else 1)


def integral(f, low, high):
    """The integral between the middles of two balls, and what their radii may add."""
    whole = acb.integral(lambda V, analytic: f(V, analytic), acb(low.mid()), acb(high.mid())).real
    for end in (low, high):
        whole += arb(0, 1) * (arb(end.rad()) * abs(f(acb(end), False).real)).upper()
    return whole


def over(mass, pieces, n, low, high):
    """M times the integral of V^n/F between two speeds."""
    total = arb(0)
    for a, b, force in pieces:
        f = lambda V, analytic: (V if n else acb(1)) / force(V, analytic)
        bottom = low if low >= ball(a) else ball(a)
        top = high if b == inf or high <= ball(b) else ball(b)
        if bottom < top:
            total += integral(f, bottom, top)
    return ball(mass) * total


def speed_at(way, length, high):
    """The speed, below `high`, at which `way` of it, which falls with speed, is `length`."""
    low, high = arb(0), high.lower()
    for _ in range(flint.ctx.prec):
        middle = arb(((low + high) / 2).mid())
        left = way(middle) - length
        if left > 0:
            low = middle
        elif left < 0:
            high = middle
        else:
            # Not decided there: nearby on both sides it is.
            width = (high - low) / 4
            for side in range(flint.ctx.prec):
                one, other = arb((middle - width).mid()), arb((middle + width).mid())
                narrower = way(one) - length > 0 and way(other) - length < 0
                if not narrower:
                    break
                low, high, width = one, other, width / 2
            break
    return low.union(high)


def fly(scene):
    events, time, depth, speed = [], arb(0), arb(0), ball(scene.speed)
    start = Fr(0)
    for index, (pieces, end, slow) in enumerate(scene.stages):
        for a, b, force in pieces:
            assert is_positive(force, max(ball(a), arb(0)), speed if b == inf else min(ball(b), speed)), "F > 0 is not proved"
        is_exit = scene.far is not None and (end is None or scene.far <= end)
        limit = scene.far if is_exit else end
        way = lambda V: depth + over(scene.mass, pieces, 1, V, speed)
        last = ball(slow) if slow is not None else arb(0)
        # A force that vanishes with V has no integral from V = 0; then a slow speed that gets there is proof as well.
        slowest = [last, *(speed.mid() / 2**10 for _ in range(last == 0))] if limit is not None else []
        left = next((left for left in (way(V) - ball(limit) for V in slowest) if left.is_finite()), arb(-1))
        assert left > 0 or (left < 0 and (not slowest or way(last).is_finite())), "whether the limit is reached is not proved"
        if left > 0:
            there = speed_at(way, ball(limit), speed)
            time += over(scene.mass, pieces, 0, there, speed)
            depth, speed, start = ball(limit), there, limit
            events.append(("exit" if is_exit else "stage-end", index, time, limit, speed))
            if is_exit:
                return "perforated", events
            continue
        time, depth, speed = time + over(scene.mass, pieces, 0, last, speed), way(last), last
        if slow is None:
            events.append(("rest", index, time, depth, Fr(0)))
            return "stopped", events
        events.append(("stage-end", index, time, depth, slow))
    raise ValueError("the flight has no end")


def is_positive(force, low, high, depth=40):
    """Whether F > 0 between two speeds is proved, but perhaps at V = 0 itself, where a force may vanish."""
    value = force(acb(low.union(high)), False).real
    if value > 0:
        return True
    if depth == 0:
        return low == 0 and not value < 0
    middle = arb(((low + high) / 2).mid())
    return is_positive(force, low, middle, depth - 1) and is_positive(force, middle, high, depth - 1)


# ------------------------------------------------------------------------------------------------ scenes


def dyadic(value, bits):
    """The decimal of `value` rounded to a multiple of 2^-bits: also an f64."""
    return f"{Decimal(round(value * 2**bits)) / 2**bits:f}"


def drawn():
    """Texts of random scenes by name: half of force, viscosity and drag alone, half with stiffness in some stage."""
    source = random.Random(21)
    between = lambda low, high: low * (high / low) ** source.random()
    found = {}
    for index in range(52):
        springs = index >= 26
        M, V, L = (between(*range_) for range_ in ((0.05, 50), (20, 900), (0.05, 3)))
        count = source.choice([1, 1, 2, 3])
        stages, end = [], 0.0
        for i in range(count):
            kind = source.choice(["p", "pq", "pq", "prq", "pr"] if not springs else ["ps", "psq", "s", "pq", "psrq", "sq"])
            share = lambda: between(0.1, 1.5) / len(kind)
            lines = []
            for key, name, scale, bits in (
                ("p", "static_force", M * V * V / L, 0),
                ("s", "stiffness", M * V * V / L**2, 0),
                ("r", "viscosity", M * V / L, 6),
                ("q", "drag", M / L, 10),
            ):
                if key in kind:
                    lines.append(f"{name} = {dyadic(share() * scale + 2.0**-bits, bits)}")
            if i + 1 < count:
                end += L * between(0.1, 0.4)
                lines.append(f"end = {dyadic(end, 12)}")
            stages.append("[[stage]]\n" + "\n".join(lines))
        far = f"[target]\nthickness = {dyadic(L * count * between(0.15, 1), 12)}\n" if source.random() < 0.5 else ""
        stages = "\n".join(stages)
        found[f"drawn-{index}"] = (
            f"[projectile]\nmass = {dyadic(M, 10)}\n[impact]\nvelocity = {dyadic(V, 2)}\n{far}{stages}\n"
        )
    return found


def written(name, text, outcome, events, **more):
    rows = [
        {"event": kind, "time_s": ends(time), "depth_m": ends(depth), "velocity_m_s": ends(velocity)}
        for kind, time, depth, velocity in events
    ]
    return {"name": name, "text": text, "outcome": outcome, "events": rows} | more


def by_flint():
    texts = {name: None for name in LAWS} | {name: text for name, text in drawn().items() if "stiffness" not in text}
    scenes = []
    for name, text in texts.items():
        outcome, events = fly(Scene(text or (SCENES / f"{name}.toml").read_text()))
        scenes.append(written(name, text, outcome, [(kind, *numbers) for kind, _, *numbers in events]))
        widest = max(abs(float(Fr(high) - Fr(low)) / float(Fr(high))) for event in scenes[-1]["events"]
                     for low, high in (event[key] for key in ("time_s", "depth_m", "velocity_m_s")) if Fr(high) != 0)  # fmt: skip
        assert widest < 1e-30, (name, widest)
    return f"python-flint {flint.__version__}, FLINT {flint.__FLINT_VERSION__}", scenes


# ------------------------------------------------------------------------------------------------ CAPD


def outward(value, slack):
    """Two f64 around an mpmath number; the number itself twice where it is one."""
    if value == mp.inf:
        return "inf inf"
    value = Fr(*value.as_integer_ratio()) if not isinstance(value, Fr) else value
    near = value.numerator / value.denominator
    if Fr(near) == value:
        return f"{near.hex()} {near.hex()}"
    low, high = near, near
    while Fr(low) > value - slack * abs(value):
        low = nextafter(low, -inf)
    while Fr(high) < value + slack * abs(value):
        high = nextafter(high, inf)
    return f"{low.hex()} {high.hex()}"


def question(name, text, repeats, is_rounded=False):
    """The line that `flight` is asked; `is_rounded`: about the f64 of all numbers."""
    mp.dps = 50
    numbers, words = exact.read(text)
    problem = exact.Problem({key: exact_number(value) for key, value in numbers.items()}, words)
    stages = problem.at(exact_number(numbers["velocity"]))
    given = set(numbers.values())

    def two(value):
        if value is None or value == mp.inf:
            return "inf inf"
        if is_rounded:
            near = float(value)
            return f"{near.hex()} {near.hex()}"
        plain = next((number for number in given if exact_number(number) == value), None)
        return outward(plain, 0) if plain is not None else outward(value, Fr(1, 10**40) if value != 0 else 0)

    far = problem.exit if problem.exit is not None else mp.inf
    lines = [name, str(repeats), two(problem.mass), two(exact_number(numbers["velocity"])), two(far), str(len(stages))]
    for stage in stages:
        lines += [two(value) for value in (stage.p, stage.s, stage.r, stage.q, stage.end)]
    return " ".join(lines), problem.crater


def exact_number(value):
    return mp.mpf(value.numerator) / value.denominator if isinstance(value, Fr) else value


def by_capd(program, repeats):
    texts = {name: None for name in FLIGHTS} | drawn()
    asked = [question(name, text or (SCENES / f"{name}.toml").read_text(), repeats) for name, text in texts.items()]
    lines = "".join(line + "\n" for line, _ in asked)
    done = subprocess.run([program], input=lines, capture_output=True, text=True, check=True)
    scenes = []
    for (name, text), (_, crater), line in zip(texts.items(), asked, done.stdout.splitlines(), strict=True):
        answer = json.loads(line, parse_float=lambda digits: Fr(float(digits)), parse_int=Fr)
        assert answer["name"] == name
        events = []
        for event in answer["events"]:
            kind = {"end": "crater-end" if crater == event["stage"] else "stage-end"}.get(event["event"], event["event"])
            numbers = [[decimal(low, False), decimal(high, True)] for low, high in (event[key] for key in ("time_s", "depth_m", "velocity_m_s"))]
            events.append({"event": kind} | dict(zip(("time_s", "depth_m", "velocity_m_s"), numbers, strict=True)))
        scene = {"name": name, "text": text, "outcome": answer["outcome"], "events": events}
        scenes.append(scene | ({"refused": answer["refused"]} if answer["refused"] else {}))
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    return version, scenes


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--capd", help="the program of benches/peers/capd")
    capd = parser.parse_args().capd
    assert flint.__version__ == FLINT, f"python-flint {FLINT} is asked for"
    program, scenes = by_capd(str(pathlib.Path(capd).resolve()), 0) if capd else by_flint()
    recipe = "python3 verification/references/enclosed.py" + (" --capd target/flight" if capd else "")
    head = json.dumps({"program": program, "recipe": recipe, "scenes": []})
    body = ",\n".join(json.dumps(scene, ensure_ascii=False, separators=(",", ":")) for scene in scenes)
    (HERE / ("capd.json" if capd else "enclosed.json")).write_text(f"{head[:-2]}\n{body}\n]}}\n")


if __name__ == "__main__":
    main()
