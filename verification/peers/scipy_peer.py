"""Peer: scipy.integrate.solve_ivp as a careful user would call it, and no more.

Each stage is one solve with the natural terminal events x = limit and V = 0. That is the point of this peer: a step
that jumps over the turning point sees x below the limit at both ends, reports V = 0 alone, and a perforation passes
for a stop. The suite must find that; nothing here works around it.
"""

import math

import peer_protocol as protocol

try:
    import numpy as np
    import scipy
    from scipy.integrate import solve_ivp
except ImportError:
    protocol.missing("scipy", "requirements.txt")

HORIZON = 1e6
"""Longest flight through a stage, in natural times."""


def event(function, direction):
    function.terminal = True
    function.direction = direction
    return function


def stage_flight(stage, method, request):
    p, s, r, q, mass, limit = stage.p, stage.s, stage.r, stage.q, stage.mass, stage.limit

    def rhs(t, y):
        x, v = y
        return [v, -(p + s * x + (r + q * v) * v) / mass]

    def jacobian(t, y):
        return [[0.0, 1.0], [-s / mass, -(r + 2.0 * q * y[1]) / mass]]

    events = [event(lambda t, y: y[1], -1)]
    if math.isfinite(limit):
        events.append(event(lambda t, y: y[0] - limit, 1))
    implicit = {"jac": jacobian} if method in ("Radau", "BDF") else {}

    def solve_stage(t, x, v):
        until = t + HORIZON * protocol.natural_time(stage, x, v)
        result = solve_ivp(
            rhs, (t, until), [x, v], method=method, events=events, rtol=request.rtol, atol=np.array(request.atol), **implicit
        )
        if result.status != 1:
            raise protocol.PeerError(f"solve_ivp status {result.status}: {result.message}")
        fired = [len(times) > 0 for times in result.t_events]
        end_x, end_v = (float(value) for value in result.y[:, -1])
        at_limit = len(fired) > 1 and fired[1]
        return protocol.Landing(float(result.t[-1]), end_x, end_v, at_limit, fired[0], int(result.nfev))

    return solve_stage


def main():
    methods = ["RK45", "DOP853", "RK23", "LSODA", "Radau", "BDF"]
    options = protocol.arguments(__doc__.splitlines()[0], methods).parse_args()

    def prepare(request):
        return [stage_flight(stage, options.method, request) for stage in request.stages]

    protocol.serve("scipy", scipy.__version__, f"solve_ivp {options.method}", prepare)


if __name__ == "__main__":
    main()
