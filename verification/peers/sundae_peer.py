"""Peer: scikit-sundae (SUNDIALS), CVODE Adams or BDF, or IDA. The cross-check.

Each stage is one solve with the events x = limit and V = 0. A step may jump over the turning point and see x below
the limit at both ends, so that V = 0 is found and the limit is missed although it lay before it. When the depth at
V = 0 lies beyond the limit, the stage is therefore solved once more, to the time of V = 0 and with x = limit alone:
depth grows monotonically until then, so the sign change cannot be missed.

CVODE at rtol 1e-12 is good to about 2e-11 on these problems, not better.
"""

import math

import peer_protocol as protocol

try:
    import numpy as np
    import sksundae
except ImportError:
    protocol.missing("scikit-sundae", "requirements.txt")

HORIZON = 1e6
"""Longest flight through a stage, in natural times."""
MAX_STEPS = 1_000_000


class Solver:
    """One SUNDIALS solver for one stage and one set of events."""

    def __init__(self, stage, method, request, watch_rest=True):
        p, s, r, q, mass, limit = stage.p, stage.s, stage.r, stage.q, stage.mass, stage.limit
        self.watch_limit, self.watch_rest = math.isfinite(limit), watch_rest

        def rhs(t, y, yp):
            v = y[1]
            yp[0] = v
            yp[1] = -(p + s * y[0] + (r + q * v) * v) / mass

        def jacobian(t, y, yp, jac):
            jac[0, 0] = 0.0
            jac[0, 1] = 1.0
            jac[1, 0] = -s / mass
            jac[1, 1] = -(r + 2.0 * q * y[1]) / mass

        def residual(t, y, yp, res):
            v = y[1]
            res[0] = yp[0] - v
            res[1] = yp[1] + (p + s * y[0] + (r + q * v) * v) / mass

        def residual_jacobian(t, y, yp, res, cj, jac):
            jac[0, 0] = cj
            jac[0, 1] = -1.0
            jac[1, 0] = s / mass
            jac[1, 1] = cj + (r + 2.0 * q * y[1]) / mass

        watch_limit = self.watch_limit

        def watch(y, out):
            if watch_limit:
                out[0] = y[0] - limit
            if watch_rest:
                out[-1] = y[1]

        def ode_events(t, y, out):
            watch(y, out)

        def dae_events(t, y, yp, out):
            watch(y, out)

        events = dae_events if method == "ida" else ode_events
        events.direction = [1] * watch_limit + [-1] * watch_rest
        events.terminal = [True] * len(events.direction)
        options = {
            "rtol": request.rtol,
            "atol": np.array(request.atol),
            "eventsfn": events,
            "num_events": len(events.direction),
            "max_num_steps": MAX_STEPS,
        }
        self.stage, self.rhs = stage, rhs
        if method == "ida":
            self.solver = sksundae.ida.IDA(residual, jacfn=residual_jacobian, **options)
        else:
            self.solver = sksundae.cvode.CVODE(
                rhs, method={"adams": "Adams", "bdf": "BDF"}[method], jacfn=jacobian, **options
            )
        self.starts_with_slope = method == "ida"

    def solve_stage(self, t, x, v, until):
        """The first event: (t, x, V, limit reached, rest reached, evaluations)."""
        y0 = np.array([x, v])
        # Three times make the solver return the last state alone instead of every step.
        span = [t, t + 0.5 * (until - t), until]
        if self.starts_with_slope:
            slope = np.empty(2)
            self.rhs(t, y0, slope)
            result = self.solver.solve(span, y0, slope)
        else:
            result = self.solver.solve(span, y0)
        if not result.success:
            raise protocol.PeerError(f"SUNDIALS status {result.status}: {result.message}")
        if result.i_events is None or len(result.i_events) == 0:
            raise protocol.PeerError(f"neither a boundary nor rest before t = {until} s, x = {result.y[-1][0]} m")
        fired, end = result.i_events[-1], result.y_events[-1]
        at_limit = bool(self.watch_limit and fired[0] != 0)
        at_rest = bool(self.watch_rest and fired[-1] != 0)
        evaluations = int(result.nfev)
        return protocol.Landing(float(result.t_events[-1]), float(end[0]), float(end[1]), at_limit, at_rest, evaluations)


def stage_flight(stage, method, request):
    both = Solver(stage, method, request)
    limit_alone = Solver(stage, method, request, watch_rest=False) if math.isfinite(stage.limit) else None

    def solve_stage(t, x, v):
        landing = both.solve_stage(t, x, v, t + HORIZON * protocol.natural_time(stage, x, v))
        if landing.at_rest and not landing.at_limit and landing.x >= stage.limit:
            again = limit_alone.solve_stage(t, x, v, landing.t)
            return again._replace(force_evaluations=again.force_evaluations + landing.force_evaluations)
        return landing

    return solve_stage


def main():
    options = protocol.arguments(__doc__.splitlines()[0], ["adams", "bdf", "ida"]).parse_args()
    shown = {"adams": "CVODE Adams", "bdf": "CVODE BDF", "ida": "IDA"}[options.method]

    def prepare(request):
        return [stage_flight(stage, options.method, request) for stage in request.stages]

    version = f"{sksundae.__version__} (SUNDIALS {sksundae.SUNDIALS_VERSION})"
    protocol.serve("scikit-sundae", version, shown, prepare)


if __name__ == "__main__":
    main()
