"""What studies answer beside their numbers: text, figures, drawings; and solvers of one's own."""

import pytest

import penetrode as pn

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


def test_every_answer_has_a_text_and_its_figures():
    answers = {
        "solve": (pn.solve(pn.scene("tunnel")), 1),
        "critical": (pn.critical("paper-slab"), 0),
        "converge": (pn.converge("tunnel", points=8), 1),
        "sweep": (pn.sweep("paper-slab", {"H/d": (1, 9, 9)}), 2),
        "map": (pn.map(), 1),
        "limit": (pn.limit("tunnel"), 0),
        "formulas": (pn.formulas("paper-slab"), 1),
        "audit": (pn.audit({"dt_s": [1e-6, 2e-6, 3e-6, 5e-6], "depth_m": [0.1, 0.11, 0.12, 0.14]}), 1),
        "diagnose": (pn.diagnose(lambda problem: (1.0, 1.0, 0.0), questions=24), 0),
    }
    for name, (answer, figures) in answers.items():
        assert len(repr(answer)) > 50 and "\x1b" not in repr(answer), name
        html = answer._repr_html_()
        assert html.startswith('<pre style="font-family:monospace">') and html.count("<img") >= figures, name
        assert answer.to_dict()["schema"].startswith(f"penetrode/{name}/"), name


def test_answers_are_drawn():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    assert len(pn.solve(pn.scene("tunnel")).plot()) == 2
    for answer in (pn.converge("tunnel", points=8), pn.sweep("tunnel", {"H/d": (1, 9, 3), "I": (1, 5, 2)}), pn.map()):
        assert answer.plot().lines
    with pytest.raises(pn.OptionError):
        pn.critical("paper-slab").plot()
    pyplot.close("all")


def test_a_wrong_drag_is_named():
    found = pn.diagnose(pn.by_stages(by_small_steps(0.5)), questions=60, name="half the drag")
    assert found.verdict == "failed"
    assert any(cause["id"] == "term:drag" and abs(cause["factor"] - 0.5) < 1e-3 for cause in found.causes), found


def by_small_steps(factor, steps=400):
    """Runge-Kutta 4 in velocity: dx/dV and dt/dV, with the drag times `factor`; rest is an end of the interval."""

    def fly(problem, stage, limit, state):
        time, depth, velocity = state

        def slope(x, v):
            force = stage.static_force + stage.stiffness * x + (stage.viscosity + factor * stage.drag * v) * v
            return force / problem.mass

        # In depth, W = V^2: dW/dx = -2 F/M; the last part to rest in velocity.
        x, v, t = depth, velocity, time
        dt = 4.0 * velocity / steps / max(slope(x, v), slope(x, 0.0), 1e-300)
        for _ in range(100 * steps):
            def step(h):
                k1 = (v, -slope(x, v))
                k2 = (v + h / 2 * k1[1], -slope(x + h / 2 * k1[0], v + h / 2 * k1[1]))
                k3 = (v + h / 2 * k2[1], -slope(x + h / 2 * k2[0], v + h / 2 * k2[1]))
                k4 = (v + h * k3[1], -slope(x + h * k3[0], v + h * k3[1]))
                return (
                    x + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]),
                    v + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]),
                )

            nx, nv = step(dt)
            if nv <= 0.0 or nx >= limit:
                least, most = 0.0, dt
                for _ in range(60):
                    middle = 0.5 * (least + most)
                    nx, nv = step(middle)
                    least, most = (least, middle) if nv <= 0.0 or nx >= limit else (middle, most)
                nx, nv = step(most)
                return t + most, min(nx, limit), nv if nx >= limit else 0.0
            x, v, t = nx, nv, t + dt
        return t, x, v

    return fly


def test_scipy_loses_exits_that_it_jumps_over():
    """A step that passes the exit and turns back behind it shows no event: known of solve_ivp, and named here."""
    pytest.importorskip("scipy")
    found = pn.diagnose(pn.ivp(method="DOP853"), questions=24)
    assert found.verdict == "failed" and found.causes[0]["id"] == "exit-missed", found


def test_a_scheme_of_ones_own_has_its_order():
    """Central difference by hand, lagged drag, rest interpolated: the first order in time that the command finds."""

    def scheme(problem):
        x, v, t, dt = 0.0, problem.velocity, 0.0, problem.dt
        while v > 0.0:
            stage = next(stage for stage in problem.stages if x < stage.end)
            a = stage.force(x, v) / problem.mass
            x, v, t = x + dt * v, v - dt * a, t + dt
        # Back to rest.
        return x - v * v / (2 * a), t + v / a, 0.0

    found = pn.converge(scheme, on="tunnel-no-drag", points=12, order=1)
    depth = next(q for q in found.quantities if q["quantity"] == "depth")
    assert depth["observed_order"] == pytest.approx(1.0, abs=0.3)
    with pytest.raises(pn.OptionError, match="on="):
        pn.converge(scheme)


def test_the_overhead_of_a_question_is_small():
    """A microsecond on an idle machine; a hundred under the load of tests."""
    import time

    def solver(problem):
        times.append(time.perf_counter())
        return 1.0, 1.0, 0.0

    times = []
    pn.diagnose(solver, questions=200, seed=2)
    gaps = sorted(b - a for a, b in zip(times, times[1:]))
    assert gaps[len(gaps) // 2] < 1e-4
