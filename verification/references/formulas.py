"""What the published formulas say of some shots, in 30 digits: formulas.json.

    python3 verification/references/formulas.py        (needs mpmath; a second)

Each formula is written here a second time, in SI units, apart from verification/formulas.toml; only its name is shared. Inputs are
decimals. `null`: no number there, outside the range of the formula too.
"""

import json
from pathlib import Path

from mpmath import log, log10, mp, mpf, pi, sqrt, nstr

mp.dps = 30

# Nose factors: of NDRC and what follows it, of Hughes, of UMIST.
N = {"flat": mpf("0.72"), "blunt": mpf("0.84"), "spherical": mpf(1), "sharp": mpf("1.14")}
N_HUGHES = {"flat": mpf(1), "blunt": mpf("1.12"), "spherical": mpf("1.26"), "sharp": mpf("1.39")}
N_UMIST = {"flat": mpf("0.72"), "blunt": mpf("0.84"), "spherical": mpf(1), "sharp": mpf("1.13")}
R = mpf


def perforated(y):
    """e/d of the ACE/NDRC relation."""
    if y <= R("1.35"):
        return R("3.19") * y - R("0.718") * y * y
    return R("1.32") + R("1.24") * y if y <= R("13.5") else None


def scabbed(y):
    """h/d of the ACE/NDRC relation."""
    if y <= R("0.65"):
        return R("7.91") * y - R("5.06") * y * y
    return R("2.12") + R("1.36") * y if y <= R("11.75") else None


def within(value, low, high):
    return R(low) <= value <= R(high)


def says(mass, diameter, strength, velocity, density, nose, aggregate):
    """Depth, perforation limit and scabbing limit (m) by each formula that holds; the others are left out."""
    M, d, fc, V, rho, a = map(mpf, (mass, diameter, strength, velocity, density, aggregate))
    n = N[nose]
    sectional = M / d**3
    found = {}
    G = R("3.8e-5") * n * M / (d * sqrt(fc)) * (V / d) ** R("1.8")
    y = 2 * sqrt(G) if G <= 1 else G + 1
    found["modified NDRC"] = (y, perforated(y), scabbed(y))
    larger = lambda limit: None if limit is None else limit + a / d
    found["Kar"] = (y, larger(perforated(y)), larger(scabbed(y)))
    degen = R("2.2") * y - R("0.3") * y * y if y <= R("1.52") else R("0.69") + R("1.29") * y
    found["Degen"] = (y, degen if y <= R("13.42") else None, None)
    x = R("3.5e-4") / sqrt(fc) * sectional * d ** R("0.215") * V ** R("1.5") + R("0.5")
    found["ACE"] = (x, perforated(x) if x >= R("1.35") else None, scabbed(x) if x >= R("0.65") else None)
    x = R("1.33e-3") / sqrt(fc) * sectional * d ** R("0.2") * V ** R("1.33")
    found["BRL"] = (x, R("1.3") * x, None)
    x = R("3.39e-4") * sectional * log10(1 + V * V / 19974)
    found["modified Petry"] = (x, 2 * x, R("2.2") * x)
    if within(V, 300, 2000):
        found["Ammann and Whitney"] = (R("6e-5") / sqrt(fc) * n * sectional * d ** R("0.2") * V ** R("1.8"), None, None)
    in_range = within(V, 0, "1127.8") and within(fc, "5.52e6", "68.95e6") and within(d, "0.0127", "0.9652")
    if in_range and within(M, "0.136", "9979.2") and within(d / a, "0.5", 50):
        power = R("97.51") / fc ** R("0.25")
        x = R("2.61") / sqrt(fc) * sectional * (d / a) ** R("0.1") * (V / R("533.4")) ** power
        found["Whiffen"] = (x, None, None)
    if within(V, 25, 300) and within(fc, "22e6", "44e6"):
        if G <= R("0.0726"):
            x = R("0.275") - sqrt(R("0.0756") - G)
        else:
            x = sqrt(4 * G - R("0.242")) if G <= R("1.0605") else G + R("0.9395")
        found["UKAEA (Barr)"] = (x, None, R("5.3") * G ** R("0.33"))
    tensile = R("0.63") * sqrt(fc / 10**6) * 10**6
    impact = M * V * V / (tensile * d**3)
    if impact <= 3500:
        x = R("0.19") * N_HUGHES[nose] * impact / (1 + R("12.3") * log(1 + R("0.03") * impact))
        thin = x <= R("0.7")
        found["Hughes"] = (x, R("3.6") * x if thin else R("1.58") * x + R("1.4"), 5 * x if thin else R("1.74") * x + R("2.3"))
    bare = M * V * V / (fc * d**3)
    impact = n * bare
    if within(impact, "0.3", 455):
        if impact <= 4:
            x = R("0.2251") * impact - R("0.0308")
        else:
            x = R("0.6740") + R("0.0567") * impact if impact <= 21 else R("1.1875") + R("0.0299") * impact
        scabbing = R("3.3437") + R("0.0342") * impact if within(impact, 21, 385) else None
        found["Haldar and Hamieh"] = (x, None, scabbing)
    if within(impact, "0.3", 21) and within(V, 27, 312) and within(d, "0.007", "0.3") and within(M, "0.11", 343):
        if impact <= 4:
            x = R("0.0416") + R("0.1698") * impact - R("0.0045") * impact**2
        else:
            x = R("0.0123") + R("0.196") * impact - R("0.008") * impact**2 + R("0.0001") * impact**3
        e = R("0.9060") + R("0.3214") * impact - R("0.0106") * impact**2
        found["Adeli and Amin"] = (x, e, R("1.8685") + R("0.4035") * impact - R("0.0114") * impact**2)
    if within(V, 20, 200) and within(fc, "30e6", "45e6"):
        e = R("0.82") * sqrt(M) * V ** R("0.75") / (rho ** R("0.125") * fc ** R("0.375") * d ** R("1.5"))
        found["CEA-EDF"] = (None, e, None)
    e, h = (61 / V) ** R("0.25") * sqrt(bare), (61 / V) ** R("0.13") * bare ** R("0.4")
    if within(V, 16, 312) and within(fc, "22.8e6", "45.5e6") and within(d, "0.0508", "0.3048"):
        found["Chang"] = (None, e, R("1.84") * h)
    found["CRIEPI"] = (None, R("0.90") * e, R("1.75") * h)
    if within(V, 3, "66.2") and within(d, "0.05", "0.6") and within(M, 35, 2500):
        dynamic = R("4.2") * fc + R("135e6") + (R("0.014") * fc + R("0.45e6")) * V
        x = 2 / pi * N_UMIST[nose] / R("0.72") * M * V * V / (dynamic * d**3)
        if x <= R("2.5"):
            found["UMIST"] = (x, None, None)
    return {name: [None if value is None else value * d for value in values] for name, values in found.items()}


def cases():
    """Mass, diameter, strength, velocity, density, nose, aggregate: every branch and range, from both sides."""
    for nose in N:
        for velocity in ("5", "28", "50", "64", "100", "180", "290", "350", "800", "1500"):
            yield "20", "0.06", "36e6", velocity, "2400", nose, "0.02"
            yield "0.906", "0.0269", "35.2e6", velocity, "2370", nose, "0.0095"
            yield "300", "0.3", "30e6", velocity, "2300", nose, "0.02"
            yield "120", "0.2", "25e6", velocity, "2300", nose, "0.5"


def main():
    found = []
    for mass, diameter, strength, velocity, density, nose, aggregate in cases():
        said = says(mass, diameter, strength, velocity, density, nose, aggregate)
        number = lambda value: None if value is None else float(nstr(value, 20))
        found.append({
            "mass_kg": float(mass), "diameter_m": float(diameter), "strength_pa": float(strength), "velocity_m_s": float(velocity),
            "density_kg_m3": float(density), "nose": nose, "aggregate_m": float(aggregate),
            "formulas": {name: [number(value) for value in values] for name, values in said.items()},
        })
    lines = ",\n".join(json.dumps(case) for case in found)
    Path(__file__).with_name("formulas.json").write_text(f"[\n{lines}\n]\n")


if __name__ == "__main__":
    main()
