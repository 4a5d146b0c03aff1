"""Solves the scene that plugs to 25 digits: `python3 verification/references/plug.py` writes `plug.json`, and prints V_c.

Needs mpmath, Python 3.11 or later, and nothing of the program; the text, its groups and Eq. 15 are read by `exact.py`, which also
says what a line of the file holds. No equation of motion is integrated: W = V² is a formula of x in the crater and in the tunnel,
the plug breaks off at the root of `R(x) - F(x, V)` (docs/theory.md, section 11), times are quadratures of dx/V, and what leaves
keeps its momentum. V_c is the speed that rests where `R = P`, the static plug: R falls faster than F on the whole way, which is
looked at, and flights on either side of V_c, 1e-10 apart, end otherwise. All is done in 40 digits and again in 55.
"""

import json
import tomllib

import exact
from mpmath import mp, mpf

NAME = "plug"


class Slab:
    def __init__(self, problem, tau, tangent, rho):
        self.mass, self.H, self.d, self.k = problem.mass, problem.thickness, problem.d, problem.k * problem.d
        self.P, self.Q = problem.P, problem.Q
        self.tau, self.tangent, self.rho = tau, tangent, rho

    def stiffness(self, speed):
        """The crater's, which the force leaves continuous."""
        return self.mass * (self.P + self.Q * speed**2) / (self.k * (self.mass + self.k * self.Q))

    def square(self, speed, x):
        """W = V² at x."""
        c = self.stiffness(speed)
        if x <= self.k:
            return speed**2 - c * x**2 / self.mass
        level = self.P / self.Q
        return (self.square(speed, self.k) + level) * mp.exp(-2 * self.Q * (x - self.k) / self.mass) - level

    def excess(self, speed, x):
        """Strength of what is left over the force."""
        r = self.H - x
        force = self.stiffness(speed) * x if x <= self.k else self.P + self.Q * self.square(speed, x)
        return mp.pi * self.tau * r * (self.d + r * self.tangent) - force

    def plug(self, x):
        r = self.H - x
        widening = r * self.tangent
        return mp.pi * self.rho * r * (self.d**2 / 4 + self.d * widening / 2 + widening**2 / 3)

    def rest(self, speed):
        """Depth of rest without a plug, behind the crater."""
        return self.k + self.mass / (2 * self.Q) * mp.log(1 + self.Q * self.square(speed, self.k) / self.P)

    def breaks(self, speed):
        """Depth at which the plug breaks off; None if the projectile rests before that."""
        end = min(self.rest(speed), self.H)
        places = [end * i / 512 for i in range(513)]
        assert all(self.excess(speed, a) > self.excess(speed, b) for a, b in zip(places, places[1:]))
        if self.excess(speed, end) > 0:
            return None
        assert self.excess(speed, self.k) > 0
        root = lambda x: self.excess(speed, x)
        return mp.findroot(root, (self.k, end), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 15))

    def time(self, speed, low, high):
        return mp.quad(lambda x: 1 / mp.sqrt(self.square(speed, x)), [low, high], method="gauss-legendre")

    def critical(self):
        rests = lambda speed: self.excess(speed, self.rest(speed))
        speed = mp.findroot(rests, (90, 110), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 15))
        assert self.breaks(speed * (1 - mpf(10) ** -10)) is None and self.breaks(speed * (1 + mpf(10) ** -10))
        return speed


def solved():
    text = (exact.SCENES / f"{NAME}.toml").read_text()
    given = tomllib.loads(text)["perforation"]
    numbers, words = exact.read(text)
    numbers = exact.decimals(numbers)
    # What the text states, its stages, groups and Eq. 15 have nothing to do with the plug.
    said, word, problem, _ = exact.answers(numbers, words, 62)
    said = {key: x for key, x in said.items() if key.startswith(("scene.", "groups.", "eq15."))}
    tau = exact.decimals({"tau": exact.quantity(given["shear_strength"], "pressure")})["tau"]
    angle, degrees = given["half_angle"].split()
    assert degrees == "deg"
    slab = Slab(problem, tau, mp.tan(mpf(angle) * mp.pi / 180), numbers["density"])
    speed = numbers["velocity"]
    x = slab.breaks(speed)
    before = mp.sqrt(slab.square(speed, x))
    after = before * slab.mass / (slab.mass + slab.plug(x))
    crater = slab.time(speed, 0, slab.k)
    broken = crater + slab.time(speed, slab.k, x)
    events = [
        ("crater-end", crater, slab.k, mp.sqrt(slab.square(speed, slab.k))),
        ("plug", broken, x, before),
        ("exit", broken + (slab.H - x) / after, slab.H, after),
    ]
    word["outcome"] = "perforated"
    for key in [key for key in word if key.startswith("events.")]:
        del word[key]
    said |= {"groups.X_over_d": slab.H / slab.d, "stage": mpf(2)}
    for i, (kind, *state) in enumerate(events):
        word[f"events.{i}.event"] = kind
        said |= {f"events.{i}.{name}": number for name, number in zip(("time_s", "depth_m", "velocity_m_s"), state)}
    said["time_s"], said["depth_m"], said["velocity_m_s"] = events[-1][1:]
    said["exit_margin"] = (after / speed) ** 2
    return word, said, slab.critical()


if __name__ == "__main__":
    answers = []
    for mp.dps in (40, 55):
        answers.append(solved())
    (words, coarse, _), (_, fine, critical) = answers
    assert abs(answers[0][2] - critical) <= mpf(10) ** -30 * critical
    for key, value in fine.items():
        assert abs(coarse[key] - value) <= mpf(10) ** -30 * abs(value), (key, coarse[key], value)
    texts = {key: mp.nstr(value, 25, min_fixed=-4, max_fixed=9).removesuffix(".0") for key, value in fine.items()}
    line = json.dumps({"name": NAME, "text": None, "words": words, "numbers": texts}, separators=(",", ":"))
    (exact.HERE / "plug.json").write_text(f'{{"recipe": "python3 verification/references/plug.py", "scenes": [\n{line}\n]}}\n')
    print("V_c", mp.nstr(critical, 25), "m/s")
