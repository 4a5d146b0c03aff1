"""Peer: heyoka's adaptive Taylor integrator with terminal events.

Coefficients and the limit are runtime parameters, so one compiled integrator serves every stage of its kind (which
coefficients are not zero, whether there is a limit) at one tolerance, and later requests compile nothing.
`--lanes N` times batch mode: N equal solves at once, the time divided by N. heyoka has no absolute tolerance.
"""

import functools
import math

import peer_protocol as protocol

try:
    import heyoka as hy
    import numpy as np
except ImportError:
    protocol.missing("heyoka", "requirements-heyoka.txt")

MAX_STEPS = 1_000_000
WINDOWS_MAX = 64
"""Time windows, each twice the one before, in which a stage must end."""


@functools.lru_cache(maxsize=64)
def compiled(kind, has_limit, rtol, lanes):
    """An integrator of x' = V, V' = -(p + s x + r V + q V^2)/M.

    Its parameters are the coefficients over M that are not zero, in order, then the limit if there is one.
    """
    x, v = hy.make_vars("x", "v")
    terms = [term for term, present in zip((hy.expression(1.0), x, v, v * v), kind) if present]
    slowing = sum((hy.par[i] * term for i, term in enumerate(terms)), start=hy.expression(0.0))
    event = hy.t_event if lanes == 1 else hy.t_event_batch
    events = [event(v, direction=hy.event_direction.negative)]
    if has_limit:
        events.append(event(x - hy.par[len(terms)], direction=hy.event_direction.positive))
    system, count = [(x, v), (v, -slowing)], len(terms) + has_limit
    if lanes == 1:
        return hy.taylor_adaptive(system, [0.0, 1.0], tol=rtol, pars=[0.0] * count, t_events=events)
    state, pars = np.ones((2, lanes)), np.zeros((count, lanes))
    return hy.taylor_adaptive_batch(system, state, tol=rtol, pars=pars, t_events=events)


def prepared(stage, rtol, lanes):
    """The integrator of a stage and its parameters."""
    has_limit = math.isfinite(stage.limit)
    coefficients = (stage.p, stage.s, stage.r, stage.q)
    integrator = compiled(tuple(c != 0.0 for c in coefficients), has_limit, rtol, lanes)
    values = np.array([c / stage.mass for c in coefficients if c != 0.0] + [stage.limit] * has_limit)
    return integrator, values if lanes == 1 else np.repeat(values[:, None], lanes, axis=1)


def propagate(integrator, lanes, start, window):
    """Index of the event that ended the flight: 0 rest, 1 the limit. Windows double until one of them does."""
    for _ in range(WINDOWS_MAX):
        if lanes == 1:
            outcome = integrator.propagate_until(start + window, max_steps=MAX_STEPS)[0]
        else:
            integrator.propagate_until(start + window, max_steps=MAX_STEPS)
            outcome = integrator.propagate_res[0][0]
        code = int(outcome)
        # A terminal event that stops is reported as -index - 1; success codes of heyoka lie far below.
        if -2 <= code <= -1:
            return -code - 1
        if outcome != hy.taylor_outcome.time_limit:
            raise protocol.PeerError(f"heyoka ended with {outcome}")
        window *= 2.0
    raise protocol.PeerError(f"neither a boundary nor rest before t = {start + window} s")


def stage_flight(stage, request, lanes):
    integrator, values = prepared(stage, request.rtol, lanes)
    # Views of the integrator's own memory: a flight of microseconds feels every look-up.
    state, pars = integrator.state, integrator.pars
    natural_time = functools.cache(functools.partial(protocol.natural_time, stage))

    def solve_stage(t, x, v):
        integrator.reset_cooldowns()
        pars[:] = values
        state[0] = x
        state[1] = v
        if lanes == 1:
            integrator.time = t
        else:
            integrator.set_time(t)
        # Under a constant force rest is at the natural time itself, and an event on the end of a window is lost.
        fired = propagate(integrator, lanes, t, 1.0625 * natural_time(x, v))
        if lanes == 1:
            (end_x, end_v), end_t = state.tolist(), integrator.time
        else:
            (end_x, end_v), end_t = state[:, 0].tolist(), float(integrator.time[0])
        # Only the first event is reported; when both fall together the state tells the other.
        at_rest = fired == 0 or end_v <= 0.0
        at_limit = fired == 1 or end_x >= stage.limit
        return protocol.Landing(end_t, end_x, end_v, at_limit, at_rest, 0)

    return solve_stage


def bare_flight(request, lanes):
    """The flight as a loop over many scenes would run it, without the bookkeeping of an answer: what is timed.

    The integrators are compiled and used again; only coefficients, state and time are set. The windows of a first
    flight are taken over, since they are found before the loop, and ended by an event like those of `propagate`.
    """
    plan, t, x, v = [], 0.0, 0.0, request.velocity
    for stage in request.stages:
        if v <= 0.0 or x >= stage.limit:
            break
        integrator, values = prepared(stage, request.rtol, lanes)
        landing = stage_flight(stage, request, lanes)(t, x, v)
        # One window to the end and a little beyond, where an event stops it anyway.
        plan.append((integrator, integrator.state, integrator.pars, values, 1.0625 * (landing.t - t)))
        t, x, v = landing.t, stage.limit if landing.at_limit else landing.x, 0.0 if landing.at_rest else landing.v
        if stage.limit == request.exit_depth:
            break

    def scalar():
        t, x, v = 0.0, 0.0, request.velocity
        for integrator, state, pars, values, window in plan:
            integrator.reset_cooldowns()
            pars[:] = values
            state[0], state[1] = x, v
            integrator.time = t
            integrator.propagate_until(t + window)
            x, v = state
            t = integrator.time
        return t, x, v

    def vector():
        t, x, v = 0.0, 0.0, request.velocity
        for integrator, state, pars, values, window in plan:
            integrator.reset_cooldowns()
            pars[:] = values
            state[0], state[1] = x, v
            integrator.set_time(t)
            integrator.propagate_until(t + window)
            x, v = state[:, 0]
            t = integrator.time[0]
        return t, x, v

    return scalar if lanes == 1 else vector


def main():
    parser = protocol.arguments(__doc__.splitlines()[0], ["taylor"])
    parser.add_argument("--lanes", type=int, default=1, metavar="N", help="solves at once when timing; default 1")
    lanes = parser.parse_args().lanes
    if not 1 <= lanes <= 64:
        parser.error("--lanes must be from 1 to 64")

    def prepare(request):
        return [stage_flight(stage, request, 1) for stage in request.stages]

    def batch(request):
        return lanes, bare_flight(request, lanes)

    method = "taylor_adaptive" if lanes == 1 else f"taylor_adaptive_batch, {lanes} lanes"
    protocol.serve("heyoka", hy.__version__, method, prepare, batch)


if __name__ == "__main__":
    main()
