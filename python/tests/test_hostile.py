"""Whatever is given, there is an answer or an exception with a sentence."""

import gc
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import penetrode as pn

GOOD = {
    "mass_kg": np.full(3, 2.0),
    "diameter_m": np.full(3, 0.05),
    "nose_factor": np.full(3, 0.72),
    "strength_pa": np.full(3, 36e6),
    "density_kg_m3": np.full(3, 2300.0),
    "velocity_m_s": np.array([100.0, 200.0, 300.0]),
}


def refused(action, *words, error=pn.Error):
    """`action` raises, and says each of `words`."""
    with pytest.raises(error) as found:
        action()
    for word in words:
        assert word in str(found.value), str(found.value)
    assert len(str(found.value)) > 10


@pytest.mark.parametrize(
    ("column", "words"),
    [
        (np.array(["a", "b", "c"]), ["velocity_m_s", "texts"]),
        (np.array([1j, 2, 3]), ["velocity_m_s", "complex"]),
        (np.array([True, False, True]), ["velocity_m_s", "bool"]),
        (np.array([1, 2, 3], "M8[s]"), ["velocity_m_s", "datetime"]),
        (np.array([object(), 1, 2], object), ["velocity_m_s", "neither"]),
        (np.ones((3, 1)), ["velocity_m_s", "(3, 1)"]),
        (np.ones((3, 3)), ["velocity_m_s", "(3, 3)"]),
        (np.ones(2), ["velocity_m_s", "2 rows"]),
        ([[1.0], [2.0, 3.0]], ["velocity_m_s"]),
        (object(), ["velocity_m_s"]),
    ],
)
def test_a_column_that_is_none(column, words):
    refused(lambda: pn.batch({**GOOD, "velocity_m_s": column}), *words, error=pn.TableError)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1.0])
def test_a_number_that_is_none_is_said_in_its_row(value):
    found = pn.batch({**GOOD, "velocity_m_s": np.array([100.0, value, 300.0])})
    assert found.bad == 1 and "row 2" in found["error"][1]
    assert np.isnan(found["depth_m"][1]) and not np.isnan(found["depth_m"][[0, 2]]).any()


@pytest.mark.parametrize(
    "view",
    [
        lambda a: a[::-1][::-1],
        lambda a: np.repeat(a, 2)[::2],
        lambda a: np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(np.float64),
        lambda a: a.astype(">f8"),
        lambda a: a.astype(np.longdouble),
        lambda a: (a.setflags(write=False), a)[1],
        lambda a: a.tolist(),
        lambda a: a.astype(np.float16),
    ],
)
def test_any_memory_holds_numbers(view):
    expected = pn.batch(GOOD)["depth_m"]
    found = pn.batch({name: view(column.copy()) for name, column in {"velocity_m_s": GOOD["velocity_m_s"]}.items()} | {
        name: column for name, column in GOOD.items() if name != "velocity_m_s"
    })
    assert np.array_equal(found["depth_m"], expected)


def test_no_rows_and_no_columns():
    assert len(pn.batch({name: column[:0] for name, column in GOOD.items()})) == 0
    assert pn.batch({name: column[:0] for name, column in GOOD.items()})["depth_m"].shape == (0,)
    refused(lambda: pn.batch({}), "mass_kg", error=pn.TableError)


@pytest.mark.parametrize("table", [None, 3, "scenes.csv", [1, 2], np.ones((3, 6)), b"x", object()])
def test_what_is_no_table(table):
    refused(lambda: pn.batch(table), "table", error=pn.TableError)


def test_names_that_are_none():
    refused(lambda: pn.batch({**GOOD, "mas_kg": 1.0}), "mas_kg", error=pn.TableError)
    refused(lambda: pn.batch({**GOOD, 3: np.ones(3)}), "name", error=pn.TableError)
    refused(lambda: pn.batch({name: c for name, c in GOOD.items() if name != "mass_kg"}), "mass_kg")
    refused(lambda: pn.batch({**GOOD, "criterion": 1.0}), "criterion", error=pn.TableError)
    assert pn.batch({**GOOD, "criterion": ["ndrc", "x", ""]}).bad == 1


def test_a_stream_that_is_none():
    class Liar:
        def __init__(self, capsule):
            self.capsule = capsule

        def __arrow_c_stream__(self, requested_schema=None):
            if isinstance(self.capsule, Exception):
                raise self.capsule
            return self.capsule

    refused(lambda: pn.batch(Liar(3)), "capsule", error=pn.TableError)
    with pytest.raises(RuntimeError, match="mine"):
        pn.batch(Liar(RuntimeError("mine")))
    pa = pytest.importorskip("pyarrow")
    capsule = pa.table(GOOD).__arrow_c_stream__()
    assert len(pn.batch(Liar(capsule))) == 3
    # A stream is read once.
    refused(lambda: pn.batch(Liar(capsule)), "stream", error=pn.TableError)
    refused(lambda: pn.batch(pa.table({**GOOD, "velocity_m_s": [[1.0], [2.0], [3.0]]})), "velocity_m_s")
    refused(lambda: pn.batch(pa.table({**GOOD, "velocity_m_s": pa.array([True, False, None])})), "velocity_m_s")


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"mass": "2 m"}, ["mass"]),
        ({"mass": -1}, ["mass"]),
        ({"mass": float("nan")}, ["mass"]),
        ({"mass": np.ones(2)}, ["mass", "ndarray"]),
        ({"mass": object()}, ["mass", "object"]),
        ({"mass": True}, ["mass"]),
        ({"mass": "2 kg", "diamter": 1}, ["diamter"]),
        ({}, ["projectile"]),
        ({"mass": "\x00"}, ["mass"]),
        ({"mass": 10**400}, ["mass"]),
    ],
)
def test_a_scene_that_is_none(keywords, words):
    refused(lambda: pn.Scene(**keywords), *words)


def test_a_scene_error_knows_its_place():
    with pytest.raises(pn.SceneError) as found:
        pn.Scene.from_toml('[projectile]\nmass = "2 m"\n')
    assert found.value.place[1:] == (2, 11) and found.value.help and "kg" in found.value.allowed
    refused(lambda: pn.Scene.from_toml("no-such-scene"), "no-such-scene", error=pn.SceneError)
    refused(lambda: pn.scene("tunnel").set({"impact.velocity": "fast"}), "fast", error=pn.SceneError)
    refused(lambda: pn.Scene.from_dict({3: 4}), "key")
    for wrong in (3, None, b"x"):
        with pytest.raises((TypeError, pn.Error)):
            pn.Scene.from_toml(wrong)


def test_options_that_are_none():
    scene = pn.scene("tunnel")
    refused(lambda: pn.solve(scene, "euler"), "euler", "taylor", error=pn.OptionError)
    refused(lambda: pn.solve(scene, dt=1e-6), "--dt", error=pn.OptionError)
    refused(lambda: pn.solve(scene, "central-difference", dt="1 kg"), "1 kg", error=pn.OptionError)
    refused(lambda: pn.solve(scene, "central-difference", dt=-1.0), "--dt", error=pn.OptionError)
    refused(lambda: pn.solve(scene, "central-difference", velocity="x"), "lagged", error=pn.OptionError)
    refused(lambda: pn.solve(scene, rtol=float("nan")), "--rtol", error=pn.OptionError)
    refused(lambda: pn.batch(GOOD, threads=0), "threads", error=pn.OptionError)
    refused(lambda: pn.critical(scene), "thickness", error=pn.OptionError)
    refused(lambda: pn.converge("tunnel", points=2), "points", error=pn.OptionError)
    refused(lambda: pn.sweep("tunnel"), "vary", error=pn.OptionError)
    refused(lambda: pn.sweep("tunnel", {"H/d": object()}), "object", error=pn.OptionError)
    refused(lambda: pn.map(-1), "k", error=pn.OptionError)
    refused(lambda: pn.solve(pn.scene("tunnel").set({"impact.velocity": 0})).trajectory(1), "n = 1")
    for wrong in (3, None, "tunnel"):
        with pytest.raises((TypeError, pn.Error)):
            pn.solve(wrong)


@pytest.mark.parametrize("times", ["x", [[1.0]], [1j], object(), [None], ["1"], [True]])
def test_times_that_are_none(times):
    flight = pn.solve(pn.scene("tunnel"))
    refused(lambda: flight.at(times), "times", error=pn.OptionError)
    refused(lambda: flight.at_depth(times), "depths", error=pn.OptionError)


def test_times_at_the_edge():
    flight = pn.solve(pn.scene("tunnel"))
    assert flight.at([])[0].shape == (0,) and flight.at(0.0)[1].tolist() == [300.0]
    assert np.isnan(flight.at([np.nan, np.inf, -0.1])[0]).all()
    assert flight.at([flight.time] * 3)[0].tolist() == [flight.depth] * 3


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (None, ["None"]),
        (3.0, ["float"]),
        ((1.0, 2.0), ["2 numbers"]),
        ("abc", ["number"]),
        ((1.0, float("nan"), 0.0), ["time is NaN"]),
        ((1.0, 2.0, float("inf")), ["velocity is inf"]),
        ({"depth_m": 1.0}, ["time_s"]),
        ({"depth_m": 1.0, "time_s": "x", "velocity_m_s": 0.0}, ["time_s"]),
        ({"depth_m": 1.0, "time_s": 1.0, "velocity_m_s": 0.0, "outcome": "gone"}, ["outcome"]),
        ({"depth_m": 1.0, "time_s": 1.0, "velocity_m_s": 0.0, "events": [1]}, ["events"]),
    ],
)
def test_a_solver_that_answers_nonsense(answer, words):
    refused(lambda: pn.diagnose(lambda problem: answer, questions=24), *words, error=pn.RunError)


def test_a_solver_that_raises_says_what_and_where():
    def solver(problem):
        raise ValueError("out of order")

    refused(lambda: pn.diagnose(solver, questions=24), "ValueError", "out of order", "test_hostile.py", error=pn.RunError)

    def sometimes(problem):
        if problem.velocity < 300:
            raise ValueError("too slow")
        return 1.0, 1.0, 0.0

    found = pn.diagnose(sometimes, questions=40)
    assert found.verdict == "failed" and any("too slow" in q["reason"] for q in found.questions)


def test_a_solver_that_hangs_is_told_from_one_that_works():
    wake = threading.Event()
    refused(lambda: pn.diagnose(lambda problem: wake.wait(20), questions=24, silence=0.3), "silent", error=pn.RunError)
    wake.set()


def test_an_interrupt_passes_through():
    def solver(problem):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pn.diagnose(solver, questions=24)


def test_ctrl_c_ends_a_long_call():
    import _thread
    import signal
    import time

    # A shell that starts tests in the background has them ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    scene = pn.scene("tunnel")
    started = time.monotonic()
    threading.Timer(0.05, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        # As many steps as are allowed: half a second at least.
        pn.solve(scene, "central-difference", dt=1e-12)
    assert time.monotonic() - started < 5


@pytest.mark.parametrize("table", [None, 3, [1], {}, {"dt_s": [1e-6]}, {"dt_s": ["a"], "depth_m": [1]}, {"dt_s": [[1]]}])
def test_an_audit_of_what_is_no_table(table):
    refused(lambda: pn.audit(table), error=pn.TableError)


def memory():
    """Resident memory of this process (bytes)."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def leaks(count):
    """Bytes a round that `count` rounds of every kind of call leave behind."""
    scene, small = pn.scene("tunnel"), pn.scene("tunnel", thickness="180 mm")

    def round(i):
        flight = pn.solve(scene)
        flight.events, flight.depth, flight.at([0.0, 1e-4]), flight.at_depth([0.01])
        if i % 100 == 0:
            pn.batch(GOOD)["outcome"], pn.Scene(mass=1.0, stage=[{"static_force": 1e6 + i}], velocity=10.0)
            pn.batch({"impact.velocity": [100.0]}, scene=scene)
            pn.critical(small)
            for wrong in (lambda: pn.solve(scene, "euler"), lambda: pn.batch({**GOOD, "velocty_m_s": 1}), lambda: pn.Scene(mass=-1)):
                with pytest.raises(pn.Error):
                    wrong()

    # What is lost is lost in every part; the allocator and new threads take and give their pages in some. The median is told.
    lost = []
    for _ in range(5):
        gc.collect()
        before = memory()
        for i in range(count // 5):
            round(i)
        gc.collect()
        lost.append((memory() - before) / (count // 5))
    return sorted(lost)[2]


@pytest.mark.skipif("not __import__('sys').platform.startswith('linux')")
def test_nothing_leaks():
    # A lost object of any kind is 50 bytes and more a call.
    assert leaks(20_000) < 20


@pytest.mark.long
def test_nothing_leaks_over_a_million_calls():
    # In a process of its own: the pages of tests before it come and go.
    program = "import test_hostile; print(test_hostile.leaks(1_000_000))"
    run = subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    assert float(run.stdout) < 1


def by_threads(count, rounds):
    """Differences that `count` threads see which solve, batch and fail side by side."""
    names = [name for name in pn.scene_names() if not name.startswith("law")]
    scenes = [pn.scene(name) for name in names]
    expected = [pn.solve(scene).depth for scene in scenes]
    table = pn.batch(GOOD)["depth_m"]
    wrong = []

    def work(which):
        try:
            for i in range(rounds):
                at = (which + i) % len(scenes)
                if pn.solve(scenes[at]).depth != expected[at]:
                    wrong.append(names[at])
                if i % 50 == 0 and not np.array_equal(pn.batch(GOOD)["depth_m"], table):
                    wrong.append("batch")
                if i % 50 == 1 and pn.map(2.0).k != 2.0:
                    wrong.append("map")
        except BaseException as error:
            wrong.append(repr(error))

    threads = [threading.Thread(target=work, args=(which,)) for which in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return wrong


def test_eight_threads_see_the_same_numbers():
    assert by_threads(8, 300) == []


@pytest.mark.long
def test_eight_threads_see_the_same_numbers_for_long():
    assert by_threads(8, 30_000) == []
