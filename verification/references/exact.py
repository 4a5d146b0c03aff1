"""Solves scenes from their text and records the numbers: `python3 verification/references/exact.py`.

The numbers of shipped scenes have 25 digits, those of the texts below 19.

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
import math
import pathlib
import random
import re
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
    "Ns": (Fr(1), (1, 1, -1)),
    "kNs": (Fr(1000), (1, 1, -1)),
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


# What follows is for units.json alone: every spelling that a scene file may have, with its value by definition. Those of
# PUBLISHED are in use with the seven digits of NIST Special Publication 811, appendix B; ancient ones with fifteen.

LONG_PREFIXES = dict(
    zip(
        "yotta zetta exa peta tera giga mega kilo hecto deca deci centi milli micro nano pico femto atto zepto yocto".split(),
        PREFIXES.values(),
        strict=True,
    )
)
LONG = {"gram": "g", "meter": "m", "second": "s", "newton": "N", "pascal": "Pa", "joule": "J", "electronvolt": "eV"}
YARD, SURVEY_FOOT, GALLON, GALLON_UK = 3 * FOOT, Fr(1200, 3937), 231 * INCH**3, Fr(454609, 10**8)
GRAIN, LIBRA, PES, MERCURY, WATER = POUND / 7000, Fr(3289, 10**4), Fr(296, 1000), Fr(133322387415, 10**9), GRAVITY
BOHR, LIGHT, BTU, AU = Fr(529177210903, 10**22), Fr(299792458), Fr(105505585262, 10**8), Fr(149597870700)
DAY, PI = Fr(86400), Fr(Decimal("3.14159265358979323846264338327950288"))
# Spelling, SI value; a plural in s goes without saying.
NAMED = {
    "lb": POUND, "lbs": POUND, "lbm": POUND, "pound": POUND, "oz": POUND / 16, "ounce": POUND / 16, "slug": LBF / FOOT,
    "ct": Fr(2, 10**4), "carat": Fr(2, 10**4), "Da": Fr(16605390666, 10**37), "dalton": Fr(16605390666, 10**37), "grain": GRAIN,
    "cwt long": 112 * POUND, "hundredweight (long)": 112 * POUND, "cwt short": 100 * POUND, "hundredweight (short)": 100 * POUND,
    "oz t": 480 * GRAIN, "troy ounce": 480 * GRAIN, "dwt": 24 * GRAIN, "pennyweight": 24 * GRAIN, "lb t": 5760 * GRAIN,
    "troy pound": 5760 * GRAIN, "AT": Fr(2916667, 10**8), "assay ton": Fr(2916667, 10**8), "2240 lb": 2240 * POUND,
    "long ton": 2240 * POUND, "2000 lb": 2000 * POUND, "short ton": 2000 * POUND, "ton": Fr(1000), "Å": Fr(1, 10**10),
    "ångström": Fr(1, 10**10), "a₀": BOHR, "bohr radius": BOHR, "bohr radiuses": BOHR, "a.u. of length": BOHR,
    "atomic unit of length": BOHR, "atomic units of length": BOHR, "ua": AU, "astronomical unit": AU, "ch": 66 * SURVEY_FOOT,
    "chain": 66 * SURVEY_FOOT, "DM": 6000 * FOOT, "data mile": 6000 * FOOT, "fathom": 6 * SURVEY_FOOT, "fermi": Fr(1, 10**15),
    "foot": FOOT, "feet": FOOT, "ft (U.S. survey)": SURVEY_FOOT, "foot (U.S. survey)": SURVEY_FOOT, "feet (U.S. survey)": SURVEY_FOOT,
    "inch": INCH, "inches": INCH, "l. y.": LIGHT * DAY * Fr(36525, 100), "light year": LIGHT * DAY * Fr(36525, 100),
    "microinch": INCH / 10**6, "microinches": INCH / 10**6, "micron": Fr(1, 10**6), "0.001 in": INCH / 1000, "mile": 5280 * FOOT,
    "mi (U.S. survey)": 5280 * SURVEY_FOOT, "mile (U.S. survey)": 5280 * SURVEY_FOOT, "miles (U.S. survey)": 5280 * SURVEY_FOOT,
    "M": Fr(1852), "nautical mile": Fr(1852), "pc": AU * 648000 / PI, "parsec": AU * 648000 / PI, "1/6 in (computer)": INCH / 6,
    "pica (computer)": INCH / 6, "picas (computer)": INCH / 6, "1/6 in": Fr(4217518, 10**9), "pica (printer's)": Fr(4217518, 10**9),
    "picas (printer's)": Fr(4217518, 10**9), "1/72 in (computer)": INCH / 72, "point (computer)": INCH / 72,
    "points (computer)": INCH / 72, "1/72 in": Fr(3514598, 10**10), "point (printer's)": Fr(3514598, 10**10),
    "points (printer's)": Fr(3514598, 10**10), "rd": Fr(33, 2) * SURVEY_FOOT, "rod": Fr(33, 2) * SURVEY_FOOT, "yard": YARD,
    "pound-force": LBF, "pounds-force": LBF, "kips": 1000 * LBF, "dyne": Fr(1, 10**5), "kilogram-force": GRAVITY,
    "kilograms-force": GRAVITY, "gram-force": GRAVITY / 1000, "grams-force": GRAVITY / 1000, "ozf": LBF / 16, "ounce-force": LBF / 16,
    "ounces-force": LBF / 16, "poundal": POUND * FOOT, "2000 lbf": 2000 * LBF, "ton-force": 2000 * LBF, "tons-force": 2000 * LBF,
    "atmosphere": Fr(101325), "atmosphere (technical)": GRAVITY * 10**4, "atmospheres (technical)": GRAVITY * 10**4,
    "mbar": Fr(100), "millibar": Fr(100), "cm Hg": MERCURY * 10, "mm Hg": MERCURY, "in Hg": MERCURY * Fr(254, 10),
    "ft Hg": MERCURY * Fr(3048, 10), "cm H₂O": WATER * 10, "mm H₂O": WATER, "in H₂O": WATER * Fr(254, 10), "ft H₂O": WATER * Fr(3048, 10),
    "cm Hg (0 °C)": Fr(133322, 100), "cm H₂O (4 °C)": Fr(980638, 10**4), "ft H₂O (39.2 °F)": Fr(298898, 100),
    "in Hg (32 °F)": Fr(338638, 100), "in Hg (60 °F)": Fr(337685, 100), "in H₂O (39.2 °F)": Fr(249082, 1000),
    "in H₂O (60 °F)": Fr(24884, 100), "Torr": Fr(101325, 760), "torr": Fr(101325, 760), "mTorr": Fr(101325, 760000),
    "millitorr": Fr(101325, 760000), "knot": Fr(1852, 3600), "c": LIGHT, "natural unit of velocity": LIGHT,
    "natural units of velocity": LIGHT, "speed of light in vacuum": LIGHT, "speeds of light in vacuum": LIGHT,
    "a₀ · Eₕ/ħ": Fr(218769126364, 10**5), "atomic unit of velocity": Fr(218769126364, 10**5), "gallon": GALLON, "gal": GALLON,
    "atomic units of velocity": Fr(218769126364, 10**5), "gal (UK)": GALLON_UK, "Imperial gallon": GALLON_UK, "hour": Fr(3600),
    "day": DAY, "minute": Fr(60), "10.0 ns": Fr(1, 10**8), "shake": Fr(1, 10**8), "a": 365 * DAY, "year": 365 * DAY,
    "Eₕ": Fr(43597447222071, 10**31), "hartree": Fr(43597447222071, 10**31), "Btu (IT)": BTU, "cal (IT)": Fr(41868, 10**4),
    "Cal (IT)": Fr(41868, 10), "kcal (IT)": Fr(41868, 10), "Btu": Fr(105435, 100), "cal": Fr(4184, 1000), "Cal": Fr(4184),
    "kcal": Fr(4184), "calorie": Fr(4184, 1000), "Calorie": Fr(4184), "kilocalorie": Fr(4184), "Btu₃₉": Fr(105967, 100),
    "Btu₅₉": Fr(10548, 10), "Btu₆₀": Fr(105468, 100), "cal₁₅": Fr(41858, 10**4), "cal₂₀": Fr(41819, 10**4), "erg": Fr(1, 10**7),
    "British thermal unit (IT)": BTU, "British thermal unit": Fr(105435, 100), "British thermal unit (39 °F)": Fr(105967, 100),
    "British thermal unit (59 °F)": Fr(10548, 10), "British thermal unit (60 °F)": Fr(105468, 100), "calorie (IT)": Fr(41868, 10**4),
    "calorie (15 °C)": Fr(41858, 10**4), "calorie (20 °C)": Fr(41819, 10**4), "Calorie (IT)": Fr(41868, 10),
    "kilocalorie (IT)": Fr(41868, 10), "ft · pdl": FOOT * POUND * FOOT, "foot poundal": FOOT * POUND * FOOT, "ft · lbf": FOOT * LBF,
    "foot pound-force": FOOT * LBF, "foot pounds-force": FOOT * LBF, "10¹⁵ Btu (IT)": 10**15 * BTU, "quad": 10**15 * BTU,
    "thm (EC)": Fr(105506, 1) * 1000, "therm (EC)": Fr(105506, 1) * 1000, "thm": Fr(1054804, 1) * 100, "therm": Fr(1054804, 1) * 100,
    "t of TNT": Fr(4184) * 10**6, "ton of TNT": Fr(4184) * 10**6, "tons of TNT": Fr(4184) * 10**6, "W · s": Fr(1), "watt second": Fr(1),
    "s (sidereal)": Fr(9972696, 10**7), "second (sidereal)": Fr(9972696, 10**7), "d (sidereal)": Fr(8616409, 100),
    "day (sidereal)": Fr(8616409, 100), "h (sidereal)": Fr(359017, 100), "hour (sidereal)": Fr(359017, 100),
    "a (sidereal)": Fr(31558150), "year (sidereal)": Fr(31558150), "a (tropical)": Fr(31556930), "year (tropical)": Fr(31556930),
    "t": Fr(1000), "kip": 1000 * LBF,
}  # fmt: skip
NAMED |= {f"{name} of mercury{at}": NAMED[f"{short} Hg{at}"] for name, short in
          [("centimeter", "cm"), ("millimeter", "mm"), ("inch", "in"), ("foot", "ft")]
          for at in ("", " (0 °C)", " (32 °F)", " (60 °F)") if f"{short} Hg{at}" in NAMED}  # fmt: skip
NAMED |= {f"{name} of water{at}": NAMED[f"{short} H₂O{at}"] for name, short in
          [("centimeter", "cm"), ("millimeter", "mm"), ("inch", "in"), ("foot", "ft")]
          for at in ("", " (4 °C)", " (39.2 °F)", " (60 °F)") if f"{short} H₂O{at}" in NAMED}  # fmt: skip
# Parts of the Roman pound of 328.9 g, and multiples of the Roman foot of 296 mm.
ROMAN = {
    "mass": {
        "libra librae": 1, "deunx deunces": Fr(11, 12), "dextans dextantes": Fr(10, 12), "dodrans dodrantes": Fr(9, 12),
        "bes bessis": Fr(8, 12), "septunx septunces": Fr(7, 12), "semis semisses": Fr(6, 12), "quincunx": Fr(5, 12),
        "triens trientes": Fr(4, 12), "quadrans_teruncius quadrantes_teruncius": Fr(3, 12), "sextans sextantes": Fr(2, 12),
        "sescuncia sescunciae": Fr(1, 8), "uncia unciae": Fr(1, 12), "semuncia semunciae": Fr(1, 24), "duella": Fr(1, 36),
        "sicilicus scilici": Fr(1, 48), "sextula sextulae": Fr(1, 72), "semisextula semisextulae": Fr(1, 144),
        "scrupulum scrupula": Fr(1, 288), "obolus oboli": Fr(1, 576), "siliqua siliquae": Fr(1, 1728),
    },
    "length": {
        "leuga leugae": 7500, "mille_passus mille_passa": 5000, "stadium stadia": 625, "actus acta": 120, "decempeda decempedae": 10,
        "passus passa": 5, "gradus": Fr(5, 2), "cubitum cubita": Fr(3, 2), "palmipes palmipedes": Fr(5, 4), "pes pedes": 1,
        "palmus_maior palmas_maior": Fr(3, 4), "palmus palmas": Fr(1, 4), "uncia unciae": Fr(1, 12), "digitus digiti": Fr(1, 16),
    },
}  # fmt: skip
# Composed of customary units, and exact all the same.
EXACT = set(
    "lb lbs lbm pound pounds oz ounce ounces slug slugs lbf pound-force pounds-force kip kips psi ksi psf pcf lbf/in² kip/in² lbf/ft² "
    "lb/ft³ lb/in³ slug/ft³ lbf/in lbf/ft lb/s slug/s lbf_s/ft lbf·s/ft lbf*s/ft lb/ft lb/in slug/ft gr grain grains".split()
)
PUBLISHED = (
    "lb oz ozf slug lbf pdl pound ounce poundal pound-force pounds-force ounce-force ounces-force ton-force tons-force kip kips cwt "
    "hundredweight dwt pennyweight survey chain ch fathom rod rd year y parsec pc computer Hg mercury H₂O water Torr torr mTorr "
    "millitorr Btu British thermal quad gal gallon short long".split()
)


def spelled(name, dimension):
    """SI value of a spelling of any form."""
    for names, share in ROMAN.get(dimension, {}).items():
        if name.replace(" ", "_") in names.split():
            return share * (LIBRA if dimension == "mass" else PES)
    name = name.replace("short tons", "short ton").replace("long tons", "long ton")
    plural = name[-1] == "s" and len(name) > 2
    one = re.sub(r"^feet ", "foot ", re.sub(r"^inches ", "inch ", name))
    for known in (name, name[:-1] if plural else name, re.sub(r"s( |$)", r"\1", name, count=1), one):
        if known in NAMED and (known == name or len(known) > 1):
            return NAMED[known]
    if " per " in name or "/" in name:
        above, below = name.split(" per " if " per " in name else "/")
        power = 1
        if below.startswith(("square ", "cubic ")):
            power, below = (2, below[7:]) if below[0] == "s" else (3, below[6:])
        elif below[-1] in "²³":
            power, below = "0123".index({"²": "2", "³": "3"}[below[-1]]), below[:-1]
        if re.match(r"(k?N|lbf)[ ·*]?s", above):
            return unit(name)[0]
        return spelled(above, None) / spelled(below, None) ** power
    for long in (name, name.removesuffix("s")):
        for prefix in ("", *LONG_PREFIXES):
            scale = Fr(10) ** LONG_PREFIXES.get(prefix, 0)
            if long.startswith(prefix) and long[len(prefix) :] in LONG:
                return atom(LONG[long[len(prefix) :]])[0] * scale
            if long == f"{prefix}watt hour":
                return 3600 * scale
    if name.endswith("W · h"):
        return 3600 * Fr(10) ** PREFIXES.get(name[:-5], 0)
    return unit(name.removesuffix("s") if name == "mils" else name)[0]


def units():
    """Every spelling of the program, in lines of one value: dimension, digits that are in use, value, spellings."""
    lines = []
    for line in (HERE.parents[1] / "src/physics/units.txt").read_text().splitlines():
        # Only what is to be said is taken from there, and no value.
        dimension, names = line.split(" | ")[:2]
        groups = {}
        for name in names.split(", "):
            value = spelled(name, dimension)
            mp.dps = 40
            decimal = mp.nstr(mpf(value.numerator) / value.denominator, 19, min_fixed=-4, max_fixed=9)
            digits = 17
            if len(decimal.split("e")[0].replace(".", "").strip("0")) > 7 and name.replace(" ", "_") not in EXACT:
                words = re.split(r"[\s/·()'.²³]+", name)
                words += [word.rstrip("s") for word in words]
                is_roman = any(name.replace(" ", "_") in names.split() for names in ROMAN.get(dimension, ()))
                digits = 15 if is_roman else 7 if any(word in PUBLISHED for word in words) else 17
            groups.setdefault((decimal.removesuffix(".0"), digits), []).append(name)
        lines += [[dimension, digits, decimal, names] for (decimal, digits), names in groups.items()]
    return lines


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
    words["title"] = root.get("title")
    words["criterion"] = root.get("perforation", {}).get("criterion", "full-depth")
    stages = root.get("stage", [])
    words["stages"] = len(stages)
    for i, stage in enumerate(stages):
        put(f"stage{i}.p", stage, "static_force", "force")
        put(f"stage{i}.s", stage, "stiffness", "stiffness")
        put(f"stage{i}.r", stage, "viscosity", "viscosity")
        put(f"stage{i}.q", stage, "drag", "drag")
        put(f"stage{i}.end", stage, "end", "length")
        if "force" in stage:
            law = stage["force"]
            lines = [line for line in (SCENES / law["table"]).read_text().splitlines() if not line.startswith("#")]
            names, *rows = [line.split(",") for line in lines]
            words[f"rows{i}"] = len(rows)
            for j, row in enumerate(rows):
                for key, dimension in (("x", "length"), ("force", "force")):
                    cell = row[names.index(law[key])] + " " + law[key].rpartition("_")[2]
                    numbers[f"stage{i}.row{j}.{key}"] = quantity(cell, dimension)
    if stages:
        return numbers, words
    put("diameter", shot, "diameter", "length")
    nose = shot["nose"]
    words["nose"] = nose.get("shape", "factor")
    for key in ("factor", "caliber_radius_head", "length_ratio", "radius_ratio"):
        put("nose", nose, key)
    put("tip", nose, "tip_ratio")
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


def nose_factor(shape, psi, tip):
    """N* (docs/theory.md, section 1); of truncated noses by quadrature of the definition, 8 y sin² over the radius."""
    if shape == "flat":
        return mpf(1)
    if shape == "hemispherical":
        return mpf(1) / 2
    if shape.startswith("truncated"):
        sine = {
            "truncated-ogive": lambda y: 1 - ((y + psi - mpf(1) / 2) / psi) ** 2,
            "truncated-cone": lambda y: (1 - tip) ** 2 / ((1 - tip) ** 2 + 4 * psi**2),
        }[shape]
        return tip**2 + mp.quad(lambda y: 8 * y * sine(y), [tip / 2, mpf(1) / 2])
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
                piece
                for i in range(words["stages"])
                for piece in (
                    self.pieces(i)
                    if f"rows{i}" in words
                    else [Stage(*(get(i, key) for key in "psrq"), n.get(f"stage{i}.end", INF))]
                )
            ]
            return
        d = self.d = n["diameter"]
        self.area = mp.pi * d * d / 4
        self.nose = nose_factor(words["nose"], n.get("nose"), n.get("tip"))
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
        if self.exit is not None and self.crater is not None and abs(self.exit - crater_depth) < mpf(10) ** -30:
            self.exit = crater_depth  # equal as fractions
        if words["criterion"] == "ndrc" and self.exit is not None:
            self.exit = perforating_depth(self.exit / d) * d

    def pieces(self, i):
        """The stages of the table of stage i, which is the only one: linear between its rows, up to the exit."""
        assert self.words["stages"] == 1
        rows = [[self.n[f"stage{i}.row{j}.{key}"] for key in ("x", "force")] for j in range(self.words[f"rows{i}"])]
        found = []
        for (x0, f0), (x1, f1) in zip(rows, rows[1:]):
            s = (f1 - f0) / (x1 - x0)
            ends = [x0 - f0 / s, x1] if f0 > 0 > f1 else [x1]  # F falls through zero: a stage ends there
            found += [Stage(f0 - s * x0, s, 0, 0, end) for end in ends]
            if self.exit is not None and x1 >= self.exit:
                found[-1].end = INF
                return found
        raise ValueError("the table ends in front of the exit")

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
        h = min(h, mpf("1.5") * mp.sqrt(mass / abs(law.s)))
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
            if law.p == 0 and law.s == 0 and law.r > 0:
                # Viscosity and drag alone slow the projectile in x, and bring it to rest at no time.
                growth = mp.exp(law.q * (x - start) / mass)
                v = (v + law.r / law.q) * growth - law.r / law.q if law.q else v + law.r * (x - start) / mass
                x, index = start, index - 1
                continue
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
                near = mpf("1.5") * mp.sqrt(mass / abs(law.s)) if law.s else INF
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
            if n["density"]:
                out["groups.N_without_nose"] = problem.mass / (n["density"] * problem.d**3)
            if problem.Q:
                out["groups.N"] = problem.mass / (problem.nose * problem.B * n["density"] * problem.d**3)
    flight = None
    if words["title"] is not None:
        word["scene.title"] = words["title"]
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
                impact = problem.mass * speed**2 / (problem.S * n["strength"] * problem.d**3)
                out["groups.I"] = impact
                # Eq. 11-12, with I of Eq. 11 under the root; N as Eq. 13 prints it; the Johnson number.
                deep = impact > problem.k * mp.pi / 4
                out["groups.X_over_d_eq11_12"] = (
                    problem.k / 2 + 2 * impact / mp.pi if deep else mp.sqrt(4 * problem.k * impact / mp.pi)
                )
                out["groups.johnson"] = n["density"] * speed**2 / n["strength"]
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
            if problem.thickness == 0:
                return out, word, problem, flight
            printed, unrounded = eq15(problem.thickness / problem.d)
            out["eq15.printed"], out["eq15.unrounded"] = problem.S * printed, problem.S * unrounded
    return out, word, problem, flight


def decimals(numbers):
    return {key: mpf(x.numerator) / x.denominator for key, x in numbers.items()}


def record(name, text, digits=25):
    """One line of the file; of a text that does not ship, only what is not said already, in fewer digits."""
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
    # Through viscosity and drag alone the flight below V_c has no end.
    if first.get("critical_velocity_m_s") and not any(law.r and not law.p and not law.s for law in problem.stages):
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
    large = {key: str(int(mp.ceil(c))) for key, c in condition.items() if 10 < c < 10**10}
    show = lambda x: mp.nstr(x, digits, min_fixed=-4, max_fixed=9, strip_zeros=True).removesuffix(".0")
    if text is not None:
        digits, last = 19, f"events.{len(flight['events']) - 1 if flight else 0}."
        for key, x in list(second.items()):
            # The last event is the end; a coefficient that is absent is zero; others follow.
            said = key in ("scene.static_force_n", "scene.drag_kg_m", "groups.X_over_d", "critical_energy_j")
            said |= key in ("groups.X_over_d_eq11_12", "groups.N_without_nose", "groups.johnson")
            said |= key == "scene.exit_depth_m" and x == second["scene.thickness_m"]
            if said or key.startswith(last) or (key.startswith("scene.stages.") and not x):
                del second[key]
    line = {"name": name, "text": text, "words": word, "numbers": {key: show(x) for key, x in second.items()}}
    if large:
        line["condition"] = {key: c for key, c in large.items() if key in second}
    return line


# Forces that are expressions are solved by laws.py, a slab that plugs by plug.py.
ELSEWHERE = ("\n[parameters]\n", 'criterion = "plug"')
SHIPPED = sorted(
    path.stem for path in SCENES.glob("*.toml") if not any(words in path.read_text() for words in ELSEWHERE)
)

# ------------------------------------------------------------------------------------------------ other texts


def digits(number, count=4):
    """A decimal of a few digits near a number."""
    return f"{float(f'{number:.{count - 1}e}'):.10g}"


# Spellings that the texts take in turn.
SPELLINGS = {
    "mass": ["kg", "g", "lb", "oz", "slug", "t", "mg", "gr", "lbs", "hg", "Mg", "dag", "pounds", "µg", "ounces", "cg"],
    "length": ["m", "mm", "in", "cm", "ft", "µm", "km", "mil", "yd", "dm", "um", "mi", "nm", "inches", "feet", "hm", "dam"],
    "pressure": ["Pa", "MPa", "psi", "ksi", "GPa", "kPa", "bar", "N/mm^2", "kgf/cm^2", "lbf/in^2", "kip/in²", "psf", "atm",
                 "N/mm²", "kgf/mm²", "at", "hPa", "TPa", "lbf/in2"],
    "density": ["kg/m^3", "g/cm^3", "lb/ft^3", "lb/in³", "slug/ft^3", "t/m³", "kg/L", "kg/m3", "pcf", "kg/dm³", "g/cm3", "kg/l",
                "lb/ft³", "kg / m ^3"],
    "velocity": ["m/s", "km/s", "ft/s", "mm/µs", "km/h", "mi/h", "in/s", "mm/ms", "cm/µs", "kn", "mm/us", "cm/s", "mm/s",
                 "ft/min", "mi/s", "dm/s"],
    "force": ["N", "kN", "lbf", "kip", "MN", "kgf", "dyn", "daN", "GN", "gf", "kips", "mN", "hN"],
    "stiffness": ["N/m", "kN/m", "N/mm", "lbf/in", "lbf/ft", "MN/m", "kN/mm", "kgf/m", "dyn/cm", "J/m²", "GN/m", "gf/cm"],
    "viscosity": ["kg/s", "N s/m", "kN s/m", "lb/s", "slug/s", "g/s", "lbf s/ft", "N·s/m", "kg/min", "t/s", "Ns/m", "t/h",
                  "N*s/m", "kg/h", "kNs/m", "lbf·s/ft", "Mg/s"],
    "drag": ["kg/m", "g/cm", "lb/ft", "slug/ft", "N s²/m²", "g/mm", "lb/in", "t/m", "g/m", "N*s^2/m^2", "t/km", "N·s²/m²", "g/km"],
}  # fmt: skip
# Spelled out, where the abbreviations of above do not say it.
ATOMS |= {name: ATOMS[short] for name, short in [("lbs", "lb"), ("pounds", "lb"), ("ounces", "oz"), ("inches", "in"),
                                                 ("feet", "ft"), ("kips", "kip")]}  # fmt: skip


class Writer:
    """Writes texts of scenes; units, forms of the file and odd digits come in turn, by a fixed random sequence."""

    def __init__(self, seed):
        self.random, self.turn = random.Random(seed), dict.fromkeys(SPELLINGS, 0)

    def between(self, low, high):
        return low * (high / low) ** self.random.random()

    def number(self, value, dimension, count=4):
        """A quantity near a value in SI units."""
        names = SPELLINGS[dimension]
        name = names[self.turn[dimension] % len(names)]
        self.turn[dimension] += 1
        text = digits(value / float(unit(name)[0]), count)
        if name == names[0] and self.turn[dimension] % 2 == 0 and "e" not in text:
            return text
        space = "" if self.turn[dimension] % 3 == 0 and name != "um" else " "
        return f"'{text}{space}{name}'"

    def table(self, name, keys, inline):
        """`name = { key = value, ... }` or `[name]` and its keys."""
        keys = [(key, value) for key, value in keys if value is not None]
        if not keys:
            return ""
        if inline:
            return f"{name} = {{ " + ", ".join(f"{key} = {value}" for key, value in keys) + " }\n"
        return f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in keys)

    def tables(self, name, entries, inline):
        bodies = [[(key, value) for key, value in keys if value is not None] for keys in entries]
        if inline:
            rows = ["{ " + ", ".join(f"{key} = {value}" for key, value in keys) + " }" for keys in bodies]
            return f"{name} = [{', '.join(rows)}]\n"
        return "".join(f"[[{name}]]\n" + "".join(f"{key} = {value}\n" for key, value in keys) for keys in bodies)

    def concrete(self, nose=None, H=None, reach=None, layers=None, **given):
        """A scene of concrete. `H` in diameters; `reach`: the impact speed over the one that comes to rest at H or, without
        H, at five diameters, roughly. Keys of `given` are taken as they are, else drawn; None leaves a key out."""
        draw = lambda key, low, high: given[key] if key in given else self.between(low, high)
        d, geometry, fc = draw("d", 0.004, 0.3), self.between(2, 150), draw("fc", 15e6, 90e6)
        rho, k, S = draw("rho", 1500, 3100), given.get("k"), given.get("S")
        B, c = given.get("B"), given.get("c")
        nose = nose or f"{{ factor = {digits(self.between(0.1, 0.97), 3)} }}"
        mass = 0.4 * geometry * max(rho, 1000) * d**3
        depth = (H if H else 5) * d
        factor = S or 72 / (fc / 1e6) ** 0.5
        force = 0.785 * d * d * factor * fc
        crater = (2 if k is None else k) * d
        work = force * (depth - crater / 2 if depth > crater else depth**2 / (2 * crater))
        drag = 0.785 * d * d * 0.4 * (1 if B is None else B) * rho
        speed = (2 * work / mass * math.exp(drag * max(depth - crater, 0) / mass)) ** 0.5 * (reach or 0)
        inline, pick = self.random.random() < 0.5, self.random.random
        stiffness = None if c is None else self.number(c * force / max(crater, d), "stiffness")
        projectile = [("mass", self.number(mass, "mass")), ("diameter", self.number(d, "length")), ("nose", nose)]
        exactly = given.get("exactly")
        if exactly:
            projectile[1] = ("diameter", exactly[0])
        target = [("strength", self.number(fc, "pressure")), ("density", self.number(rho, "density") if rho else "0")]
        if H:
            target.append(("thickness", exactly[1] if exactly else self.number(H * d, "length")))
        if layers:
            entries = [
                [
                    ("thickness", None if h is None else self.number(h * d, "length")),
                    ("strength", self.number(strength, "pressure") if strength else "0"),
                    ("density", self.number(density, "density") if density else "0"),
                    ("S", own),
                    ("viscosity", None if r is None else self.number(r * force / speed, "viscosity")),
                ]
                for h, strength, density, own, r in layers
            ]
            body = self.tables("target.layer", entries, False)
        else:
            body = self.table("target", target, inline)
        law = [("S", S), ("B", B), ("k", k), ("crater_stiffness", stiffness)]
        if c is None and pick() < 0.2:
            law[3] = ("crater_stiffness", "'continuous'")
        criterion = given.get("criterion")
        texts = [
            self.table("projectile", projectile, inline),
            self.table("resistance", law, inline),
            self.table("perforation", [("criterion", f"'{criterion}'" if criterion else None)], inline),
            self.table("impact", [("velocity", self.number(speed, "velocity") if reach else None)], inline),
        ]
        self.random.shuffle(texts)
        title = f"title = 'scene {self.random.randrange(1000)}, of text'\n" if pick() < 0.3 else ""
        return title + "".join([body, *texts] if body.startswith("target =") else [*texts, body])

    def stages(self, laws, H=None, M=None, V=None, L=None, end=None):
        """A scene of stages. Each law: shares of M V^2/L, M V^2/L^2, M V/L and M/L, and its end over L; None leaves out."""
        M, V, L = M or self.between(0.02, 60), V or self.between(20, 900), L or self.between(0.03, 2)
        units = [("static_force", M * V * V / L, "force"), ("stiffness", M * V * V / L**2, "stiffness"),
                 ("viscosity", M * V / L, "viscosity"), ("drag", M / L, "drag"), ("end", L, "length")]  # fmt: skip
        far = self.number(H * L, "length") if H else None
        entries = [
            [
                # An end at the far side is written alike, to be there exactly.
                (key, None if share is None else far if key == "end" and share == H else self.number(share * scale, dimension))
                for (key, scale, dimension), share in zip(units, law, strict=True)
            ]
            for law in laws
        ]
        self.random.shuffle(units)
        inline = self.random.random() < 0.5
        texts = [
            self.table("projectile", [("mass", self.number(M, "mass"))], inline),
            self.table("impact", [("velocity", self.number(V, "velocity"))], inline),
            self.table("target", [("thickness", far)], inline),
        ]
        self.random.shuffle(texts)
        body = self.tables("stage", entries, inline)
        return "".join([body, *texts] if inline else [*texts, body])


def texts():
    """Names and texts, in an order from the plain to the odd."""
    w, found = Writer(15), {}
    add = found.__setitem__
    for shape, key, values in (
        ("ogive", "caliber_radius_head", ("0.55", "1.9", "4.25", "6")),
        ("cone", "length_ratio", ("0.31", "0.9", "2.7")),
        ("spherical", "radius_ratio", ("0.61", "0.83", "1.7", "7")),
    ):
        for i, psi in enumerate(values):
            nose = f"{{ shape = '{shape}', {key} = {psi} }}"
            H, reach = ((None, 0.8), (6.3, 1.3), (4.1, 0.9), (3.3, 1.6))[i]
            add(f"{shape} {psi}", w.concrete(nose, H, reach))
    add("flat stop", w.concrete("{ shape = 'flat' }", None, 1.2))
    add("flat exit", w.concrete("{ shape = 'flat' }", 3.7, 1.4))
    # Eq. 14 below, within and above its fit, each stopped and not.
    for fc in (4.3e6, 9.7e6, 13.1e6, 27e6, 64.7e6, 101e6, 137e6, 211e6):
        reach = w.between(1.1, 1.7) if len(found) % 2 else w.between(0.55, 0.9)
        add(f"fc {fc / 1e6:g}", w.concrete(None, w.between(1.2, 9), reach, fc=fc, k=1.37 if len(found) % 3 else None))
    # Each number of [resistance] alone, and together.
    for name, given in {
        "S": dict(S=17.3), "small S": dict(S=3.19), "B": dict(B=1.83), "small B": dict(B=0.27), "k": dict(k=3.1),
        "small k": dict(k=0.707), "no k": dict(k=0), "no B": dict(B=0), "no rho": dict(rho=0), "c": dict(c=0.87),
        "small c": dict(c=0.21), "large c": dict(c=2.9), "SB": dict(S=8.6, B=1.27), "Sk": dict(S=9.9, k=2.6),
        "Bk": dict(B=0.71, k=1.43), "Sc": dict(S=11.3, c=1.9), "kc": dict(k=3.7, c=1.2), "SBkc": dict(S=14.7, B=1.61, k=2.3, c=0.64),
        "SBk": dict(S=6.1, B=0.43, k=4.1), "no k c": dict(k=0, c=1.3),
    }.items():  # fmt: skip
        add(f"{name} exit", w.concrete(None, w.between(2.2, 9), w.between(1.15, 1.8), **given))
        if len(given) == 1:
            add(f"{name} stop", w.concrete(None, None if len(found) % 3 else w.between(2.2, 9), w.between(0.6, 0.93), **given))
    # Far sides: within the crater, at its end, none, nothing, and without an impact.
    for H in (0.23, 0.9, 1.3, 1.7):
        add(f"thin {H}", w.concrete(None, H, w.between(1.2, 2.5) if H in (0.9, 1.7) else w.between(0.4, 0.85)))
    add("H = k d exit", w.concrete(None, 2, 1.3, exactly=("'3 in'", "'6 in'"), d=0.0762))
    add("H = k d stop", w.concrete(None, 2, 0.7, exactly=("'16 mm'", "'3.2cm'"), d=0.016))
    add("H = k d, k = 3", w.concrete(None, 3, 1.6, exactly=("'0.2 ft'", "'7.2 in'"), d=0.06096, k=3, S=7.7))
    add("no impact", w.concrete(None, 4.4, None))
    add("no impact, c", w.concrete(None, 2.9, None, c=1.7, k=1.1, S=10.3, B=1.4))
    add("no thickness", w.concrete(None, 1.9, 1.2, exactly=("'37 mm'", "'0 in'")))
    add("no speed", w.concrete(None, 3.1, 1e-9).replace("velocity =", "velocity = 0 #"))
    add("slow in the crater", w.concrete(None, None, 0.05))
    for name, H, reach, given in (
        ("ndrc thin", 1.1, 1.4, {}), ("ndrc first", 2.6, 0.8, dict(k=1.2)), ("ndrc between", 2.996, 1.3, {}),
        ("ndrc second", 3.4, 0.9, dict(S=9.1)), ("ndrc third", 7.7, 0.5, dict(B=1.9)), ("ndrc thick", 16.3, 1.2, dict(c=1.3)),
        ("ndrc beyond", 21.4, 0.9, {}), ("full depth", 5.2, 1.3, {}), ("eq15 beyond", 19.7, 1.1, {}),
    ):  # fmt: skip
        criterion = "ndrc" if name.startswith("ndrc") else "full-depth"
        add(name, w.concrete(None, H, reach, criterion=criterion, **given))
    # Layers: thickness in diameters, strength, density, S, viscosity as a share of the force.
    for name, layers, given in (
        ("two layers", [(3.1, 41e6, 2310, None, None), (2.3, 67e6, 2570, None, None)], dict(reach=1.3)),
        ("two layers stop", [(3.1, 41e6, 2310, None, None), (4.3, 67e6, 2570, None, None)], dict(reach=0.9)),
        ("S of each layer", [(2.7, 41e6, 2310, 9.3, None), (3.3, 28e6, 2110, 16.1, None)], dict(reach=1.1)),
        ("S of one layer", [(2.9, 37e6, 2290, None, None), (3.7, 53e6, 2410, 7.3, None)], dict(reach=0.9, S=13.9)),
        ("S of no layer", [(2.3, 47e6, 2270, None, None), (2.6, 33e6, 2050, None, None)], dict(reach=1.2, S=10.7)),
        ("S by Eq. 14 beside", [(2.6, 7.7e6, 1870, None, None), (3.1, 149e6, 2680, 5.9, None)], dict(reach=1.1)),
        ("viscous layer", [(2.4, 36e6, 2330, None, None), (1.9, 44e6, 2440, None, 0.31)], dict(reach=1.3)),
        ("viscous layers", [(2.7, 31e6, 2130, 12.7, 0.17), (2.1, 57e6, 2490, None, 0.43)], dict(reach=1.6)),
        ("viscous stop", [(3.3, 43e6, 2390, None, 0.23), (None, 29e6, 2080, None, 0.37)], dict(reach=0.8)),
        ("viscous in a gap", [(2.8, 51e6, 2370, None, None), (1.4, 0, 0, None, 0.11), (1.7, 38e6, 2210, None, None)], dict(reach=1.3)),
        ("gap", [(2.5, 34e6, 2260, None, None), (3.6, 0, 0, None, None), (1.3, 71e6, 2610, None, None)], dict(reach=1.1, S=9.7)),
        ("gap stop", [(2.2, 34e6, 2260, None, None), (1.1, 0, 0, None, None), (None, 71e6, 2610, None, None)], dict(reach=0.9)),
        ("water in a gap", [(2.9, 42e6, 2340, None, None), (2.7, 0, 998, None, None), (1.2, 26e6, 2160, None, None)], dict(reach=1.4)),
        ("crater over layers", [(0.6, 83e6, 2710, None, None), (0.7, 19e6, 1930, None, None), (3.2, 46e6, 2420, None, None)], dict(reach=1.1)),
        ("crater to a weak layer", [(1.4, 91e6, 2730, None, None), (2.2, 17e6, 1890, None, None), (1.9, 58e6, 2480, None, None)], dict(reach=1.2, k=1.9)),
        ("thinner than the crater", [(0.4, 45e6, 2350, None, None), (0.9, 62e6, 2540, 8.9, None)], dict(reach=0.8, k=2.7)),
        ("layers without crater", [(1.3, 23e6, 1990, None, None), (1.6, 48e6, 2450, None, 0.13), (1.1, 39e6, 2240, 18.3, None)], dict(reach=1.2, k=0, B=1.31)),
        ("layers and c", [(2.6, 54e6, 2460, None, None), (1.7, 32e6, 2180, None, None)], dict(reach=1.3, c=1.23, B=0.83)),
        ("layers and c stop", [(2.3, 49e6, 2430, None, None), (2.9, 35e6, 2220, None, None)], dict(reach=0.8, c=0.67, k=1.7)),
        ("layers ndrc", [(2.4, 44e6, 2360, None, None), (2.7, 61e6, 2520, None, None)], dict(reach=1.1, criterion="ndrc")),
        ("five layers", [(0.9, 30e6, 2120, None, None), (1.7, 55e6, 2470, 10.9, None), (0.8, 0, 0, None, None),
                         (1.9, 76e6, 2630, None, 0.07), (1.2, 24e6, 2020, None, None)], dict(reach=1.5, k=1.6, B=1.17)),
    ):  # fmt: skip
        add(name, w.concrete(None, None, layers=layers, **given))
    # Stages: p, s, r, q and the end, as shares of what stops the projectile about a length L.
    none = None
    for name, laws, H in (
        ("p", [(0.43, none, none, none, none)], none),
        ("s", [(none, 0.83, none, none, none)], 0.7),
        ("ps", [(0.27, 0.61, none, none, none)], none),
        ("pr", [(0.31, none, 0.47, none, none)], none),
        ("sr under", [(none, 1.7, 0.61, none, none)], none),
        ("sr over", [(none, 0.19, 1.9, none, none)], none),
        ("psr under", [(0.23, 1.3, 0.41, none, none)], 0.9),
        ("psr over", [(0.17, 0.29, 2.3, none, none)], none),
        ("pq", [(0.37, none, none, 0.59, none)], none),
        ("sq", [(none, 0.79, none, 0.33, none)], none),
        ("psq", [(0.21, 0.53, none, 0.39, none)], 0.47),
        ("prq", [(0.19, none, 0.23, 0.41, none)], none),
        ("srq", [(none, 0.67, 0.29, 0.37, none)], none),
        ("psrq", [(0.13, 0.47, 0.26, 0.34, none)], none),
        ("psrq exit", [(0.11, 0.36, 0.24, 0.31, none)], 0.57),
        ("r exit", [(none, none, 0.83, none, none)], 0.61),
        ("q exit", [(none, none, none, 1.3, none)], 1.7),
        ("rq exit", [(none, none, 0.37, 0.43, none)], 0.9),
        ("nothing, then p", [(none, none, none, none, 0.41), (0.83, none, none, none, none)], none),
        ("two", [(0.31, 0.23, 0.17, 0.13, 0.37), (0.19, 0.41, 0.29, 0.07, none)], none),
        ("two exit", [(0.14, 0.33, 0.09, 0.21, 0.29), (0.26, 0.12, 0.18, 0.06, none)], 0.73),
        ("three", [(0.11, none, 0.16, 0.22, 0.23), (none, 0.53, none, 0.31, 0.59), (0.43, 0.27, 0.13, none, none)], none),
        ("three exit", [(none, 0.71, none, none, 0.19), (0.24, none, none, 0.37, 0.43), (0.09, 0.28, 0.21, none, none)], 0.67),
        ("stiffness later", [(0.22, none, none, 0.18, 0.31), (none, 0.91, none, none, none)], 0.83),
        ("stiffness later, viscous", [(0.12, 0.17, none, 0.15, 0.27), (0.07, 0.63, 0.33, none, none)], none),
        ("four", [(0.16, 0.21, none, none, 0.17), (0.29, none, none, 0.23, 0.31), (none, none, 0.37, none, 0.47), (0.41, 0.13, none, 0.11, none)], none),
        ("an end at H", [(0.19, 0.27, none, 0.14, 0.53)], 0.53),
        ("an end beyond H", [(0.23, none, none, 0.32, 0.21), (0.15, 0.24, none, 0.09, 0.97)], 0.49),
        ("H within the first", [(0.17, 0.38, none, 0.26, 0.71), (0.33, none, none, 0.12, none)], 0.43),
        ("H within the first, stop", [(0.83, 0.94, none, 0.46, 0.77), (0.31, none, none, 0.19, none)], 0.69),
        ("driven", [(-0.31, none, none, 0.23, none)], 1.3),
        ("driven, then stopped", [(-0.23, 0.11, none, none, 0.61), (0.67, 0.37, none, 0.19, none)], none),
        ("driven and viscous", [(-0.17, 0.09, 0.43, none, none)], 0.8),
        ("a barrier, then driven", [(0.57, none, none, 0.13, 0.53), (-0.41, none, none, 0.21, none)], 1.4),
        ("a barrier that stops", [(0.97, 0.83, none, 0.13, 0.79), (-0.29, none, none, 0.17, none)], 1.2),
        ("driven, then a viscous barrier", [(-0.19, none, none, none, 0.33), (0.23, 0.14, 0.27, 0.16, none)], 0.71),
    ):  # fmt: skip
        add(f"stages {name}", w.stages(laws, H))
    # Noses, groups and far sides at random.
    noses = ["shape = 'flat'", "shape = 'ogive', caliber_radius_head = {:.3g}", "shape = 'cone', length_ratio = {:.3g}",
             "shape = 'spherical', radius_ratio = {:.3g}"]  # fmt: skip
    for i in range(5):
        nose = "{ " + noses[i % 4].format(w.between(0.6, 5)) + " }"
        law = {key: float(digits(w.between(low, high), 3)) for key, low, high in (("S", 4, 20), ("B", 0.4, 2.5), ("k", 0.5, 4))}
        H = w.between(0.8, 12)
        add(f"mixed {i}", w.concrete(nose, H, w.between(0.5, 2), fc=w.between(9e6, 180e6), c=w.between(0.3, 2), **law))
    # Behind all others, whose random numbers stay the same.
    for nose, H, reach in (
        ("shape = 'truncated-ogive', caliber_radius_head = 2.9, tip_ratio = 0.37", None, 0.9),
        ("shape = 'truncated-ogive', tip_ratio = 0.71, caliber_radius_head = 0.55", 3.9, 1.4),
        ("shape = 'truncated-cone', length_ratio = 0.83, tip_ratio = 0.29", 5.3, 0.8),
        ("shape = 'truncated-cone', length_ratio = 1.7, tip_ratio = 0.62", None, 1.3),
        ("shape = 'hemispherical'", 2.7, 1.6),
    ):
        add(nose.split("'")[1] + (" exit" if H else " stop"), w.concrete(f"{{ {nose} }}", H, reach))
    return found


def main():
    lines = [record(name, None) for name in SHIPPED] + [record(name, text) for name, text in texts().items()]
    head = json.dumps({"recipe": "python3 verification/references/exact.py", "scenes": []})
    body = ",\n".join(json.dumps(line, ensure_ascii=False, separators=(",", ":")) for line in lines)
    rows = ",\n".join(json.dumps(line, ensure_ascii=False, separators=(",", ":")) for line in units())
    (HERE / "units.json").write_text(f"[\n{rows}\n]\n")
    (HERE / "exact.json").write_text(head[:-2] + "\n" + body + "\n]}\n")


if __name__ == "__main__":
    main()
