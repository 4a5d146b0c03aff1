"""Every number is that of the command, bit for bit."""

import csv
import io
import json

import numpy as np
import pytest
from conftest import SCENES

import penetrode as pn

METHODS = ["taylor", "energy", "closed-form", "central-difference", "tsit45", "bdf", "esdirk34", "tr-bdf2", "adaptive"]


def built():
    """The methods of this build."""
    has_diffsol = True
    try:
        pn.solve(pn.scene("tunnel"), "tsit45")
    except pn.OptionError:
        has_diffsol = False
    return METHODS if has_diffsol else METHODS[:4]


def without_times(answer):
    """`answer` without what is measured of the clock."""
    if isinstance(answer, dict):
        return {key: without_times(value) for key, value in answer.items() if key not in ("wall_ns", "wall_ms")}
    return [without_times(part) for part in answer] if isinstance(answer, list) else answer


@pytest.mark.parametrize("method", built())
def test_solve(ask, method):
    """A flight by attributes, and as the command has it. All shipped scenes in one test: a process each is slow enough."""
    for name in SCENES:
        scene = pn.scene(name)
        try:
            flight = pn.solve(scene, method)
        except (pn.OptionError, pn.RunError):
            with pytest.raises(AssertionError):
                ask("solve", name, f"--method={method}")
            continue
        answer = ask("solve", name, f"--method={method}")
        assert without_times(flight.to_dict()) == without_times(answer), name
        end = [flight.outcome, flight.depth, flight.time, flight.velocity, flight.stage]
        assert end == [answer[key] for key in ("outcome", "depth_m", "time_s", "velocity_m_s", "stage")], name
        assert [flight.exit_margin, flight.exit_margin_error] == [answer["exit_margin"], answer["exit_margin_error"]]
        listed = [(e.event, e.time, e.depth, e.velocity) for e in flight.events]
        keys = ("event", "time_s", "depth_m", "velocity_m_s")
        assert listed == [tuple(event[key] for key in keys) for event in answer["events"]], name


def test_critical(ask):
    for name in SCENES:
        try:
            found = pn.critical(name)
        except (pn.OptionError, pn.RunError):
            with pytest.raises(AssertionError):
                ask("critical", name)
            continue
        assert found.to_dict() == ask("critical", name), name
        if found.velocity is None:
            continue
        assert found.energy == pytest.approx(0.5 * pn.scene(name).mass * found.velocity**2, rel=1e-15)


def test_spread_of_v_c(ask):
    found = pn.critical("paper-slab", spread={"target.strength": "5%"}, samples=1000)
    words = ("critical", "paper-slab", "--spread", "target.strength=5%", "--samples", "1000")
    assert found.to_dict() == ask(*words)


@pytest.mark.filterwarnings("ignore")
def test_sweep(ask):
    assert pn.sweep("paper-slab", **{"H/d": (0.5, 18, 50)}).to_dict() == ask("sweep", "paper-slab", "--vary=H/d=0.5:18:50")
    two = pn.sweep("tunnel", {"H/d": (1, 5, 3), "target.strength": "20e6:40e6:4:log"})
    assert two.to_dict() == ask("sweep", "tunnel", "--vary=H/d=1:5:3", "--vary=target.strength=20e6:40e6:4:log")


def test_map(ask):
    assert pn.map(1.5).to_dict() == ask("map", "--k=1.5")


@pytest.mark.parametrize("scene", ["tunnel", "perforate", "law-power"])
def test_enclose(ask, scene):
    found = pn.enclose(scene)
    assert without_times(found.to_dict()) == without_times(ask("solve", scene, "--method=enclosure"))
    box = {"projectile.mass": (1.9, 2.1)}
    words = ("solve", scene, "--method=enclosure", "--box=projectile.mass=1.9:2.1")
    assert without_times(pn.enclose(scene, box).to_dict()) == without_times(ask(*words))
    low, high = found.enclosure["depth_m"]
    assert low <= high <= low + 4e-16
    assert pn.solve(pn.scene(scene)).depth == pytest.approx(low, rel=4e-15)


@pytest.mark.parametrize("scene", ["tunnel", "paper-slab", "layered"])
def test_limit(ask, scene):
    assert pn.limit(scene).to_dict() == ask("limit", scene)


@pytest.mark.parametrize("scene", ["tunnel", "paper-slab", "forrestal-1994-shot-14"])
def test_formulas(ask, scene):
    assert pn.formulas(scene).to_dict() == ask("formulas", scene)
    assert pn.formulas(scene, nose="flat").to_dict() == ask("formulas", scene, "--nose=flat")


@pytest.mark.parametrize("scene", ["paper-slab", "layered"])
def test_export(ask, tmp_path, scene):
    found = pn.export(pn.scene(scene), tmp_path / "a", dt="2 us")
    assert found.to_dict() == ask("export", "abaqus", scene, "--out=b", "--dt=2us", cwd=tmp_path)
    ours, theirs = ({path.relative_to(top): path.read_bytes() for path in top.rglob("*.*") if path.is_file()}
                    for top in (tmp_path / "a", tmp_path / "b"))  # fmt: skip
    assert ours == theirs and len(ours) >= len(found.files)
    with pytest.raises(pn.OptionError, match="LS-DYNA"):
        pn.export(scene, tmp_path / "c", "lsdyna")


def test_experiments(ask):
    assert pn.experiments().to_dict() == ask("experiments")


def test_converge(ask):
    words = ("converge", "tunnel", "--velocity=centred", "--events=interpolated", "--dt=100ns:10us", "--points=12")
    options = {"velocity": "centred", "events": "interpolated", "dt": ("100ns", "10us"), "points": 12}
    assert pn.converge("tunnel", **options).to_dict() == ask(*words)
    for name in ("paper-slab", "perforate", "layered"):
        assert pn.converge(name, points=8).to_dict() == ask("converge", name, "--points=8"), name


def test_audit_of_a_dict_is_that_of_the_file(ask, tmp_path):
    steps = [1e-6 * 1.37**i for i in range(8)]
    depths = [pn.solve(pn.scene("tunnel"), "central-difference", dt=step, velocity="centred").depth for step in steps]
    table = {"dt_s": np.array(steps), "depth_m": depths}
    lines = ["dt_s,depth_m", *(f"{a!r},{b!r}" for a, b in zip(steps, depths))]
    (tmp_path / "table").write_text("\n".join(lines) + "\n")
    found = pn.audit(table, scene="tunnel", order=1)
    assert found.to_dict() == ask("audit", "table", "--scene=tunnel", "--order=1", cwd=tmp_path)
    assert pn.audit(tmp_path / "table", scene="tunnel", order=1).quantities == found.quantities


def random_table(count, seed=7):
    """`count` random scenes as columns, over many orders of magnitude."""
    chance = np.random.default_rng(seed)

    def uniform(least, most):
        return chance.uniform(least, most, count)

    table = {
        "mass_kg": 10 ** uniform(-2, 2),
        "diameter_m": 10 ** uniform(-2.5, -0.5),
        "nose_factor": uniform(0, 1),
        "strength_pa": 10 ** uniform(6.5, 8.5),
        "density_kg_m3": uniform(1000, 3000),
        "thickness_m": 10 ** uniform(-2, 1),
        "k": uniform(0, 4),
        "velocity_m_s": 10 ** uniform(0, 3.2),
    }
    return table


def csv_of(table):
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    writer.writerows(zip(*(map(repr, column.tolist()) for column in table.values())))
    return text.getvalue()


@pytest.mark.parametrize(
    ("method", "count"),
    [
        *((method, 1000 if method == "central-difference" else 10_000) for method in built()),
        pytest.param("central-difference", 10_000, marks=pytest.mark.long),
    ],
)
def test_batch_of_random_scenes(command, tmp_path, method, count):
    table = random_table(count)
    (tmp_path / "in.csv").write_text(csv_of(table))
    critical = ["--critical"] if method == "taylor" else []
    command("batch", "in.csv", "--out=out.csv", f"--method={method}", *critical, codes=(0, 3), cwd=tmp_path)
    with open(tmp_path / "out.csv", newline="") as file:
        expected = list(csv.DictReader(file))
    found = pn.batch(table, method, critical=bool(critical))
    assert len(found) == len(expected) == count
    for name in found.columns:
        column = [row[name] for row in expected]
        if name == "outcome":
            assert [text or "" for text in found[name]] == column
        elif name != "error":
            numbers = np.array([float(cell) if cell else np.nan for cell in column])
            assert np.array_equal(found[name], numbers, equal_nan=True), name


@pytest.mark.parametrize("method", ["taylor", "energy", "closed-form"])
def test_solve_is_batch_for_random_scenes(method):
    """10,000 scenes one by one: the flight is that of its row. The lanes of taylor round in another order."""
    table = random_table(10_000, seed=11)
    found = pn.batch(table, method)
    ends = np.column_stack([found[name] for name in ("depth_m", "time_s", "velocity_m_s")])
    flights = []
    for i in range(10_000):
        flight = pn.solve(pn.Scene(**{name_of(key): column[i] for key, column in table.items()}), method)
        flights.append((flight.depth, flight.time, flight.velocity))
    if method == "taylor":
        np.testing.assert_allclose(flights, ends, rtol=1e-9, atol=1e-9)
    else:
        assert np.array_equal(flights, ends)


def test_solve_of_random_scenes(ask, tmp_path):
    """A process each: a hundred scenes as the command solves them."""
    table = random_table(100, seed=13)
    for i in range(100):
        scene = pn.Scene(**{name_of(key): column[i] for key, column in table.items()})
        (tmp_path / "scene.toml").write_text(scene.text)
        answer = ask("solve", "scene.toml", cwd=tmp_path)
        flight = pn.solve(scene)
        end = (flight.outcome, flight.depth, flight.time, flight.velocity, flight.exit_margin)
        assert end == tuple(answer[key] for key in ("outcome", "depth_m", "time_s", "velocity_m_s", "exit_margin"))


def name_of(column):
    """The keyword of a column."""
    units = ("_kg_m3", "_m_s", "_kg", "_pa", "_m")
    return next((column.removesuffix(unit) for unit in units if column.endswith(unit)), column)


def test_batch_by_a_scene(command, tmp_path):
    speeds = np.linspace(50, 400, 300)
    (tmp_path / "in.csv").write_text("impact.velocity\n" + "\n".join(map(repr, speeds.tolist())) + "\n")
    command("batch", "in.csv", "--scene=law-power", "--out=out.csv", codes=(0, 3), cwd=tmp_path)
    with open(tmp_path / "out.csv", newline="") as file:
        expected = [float(row["depth_m"]) for row in csv.DictReader(file)]
    assert pn.batch({"impact.velocity": speeds}, scene=pn.scene("law-power"))["depth_m"].tolist() == expected


def test_verify_a_part(ask, tmp_path):
    words = ("verify", "--only=closed-form/50-digits/tunnel", "--out=report")
    found, expected = pn.verify(only="closed-form/50-digits/tunnel"), ask(*words, cwd=tmp_path)
    assert without_times(found.claims) == without_times(expected["claims"])
    assert json.dumps(found.counts) == json.dumps(expected["counts"])
