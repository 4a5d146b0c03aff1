# A solver of your own, asked by penetrode: it reads one question a line and answers one a line, both in JSON.
#
#     penetrode diagnose "julia peer.jl"                         what is wrong?
#     penetrode verify --only peer/user --peer "julia peer.jl"   does it agree?
#
# It runs as it stands. YOUR INTEGRATOR GOES INTO `solve_stage`; all below it is the protocol and may stay as it is.
# SI units throughout. In each stage, with x counted from the impact face,
#
#     dx/dt = V,    M dV/dt = -(p + s x + r V + q V^2),    until V = 0, the end of the stage or the exit depth.

# Who you are. A solver with steps of one size adds "fixed_step": true; each question then has the step to use,
# question["dt_s"], and rtol and atol mean nothing. One that computes its forces itself adds "reads": "scene"; each
# question then has the physical scene, question["scene"]: mass_kg, diameter_m, strength_pa ...
const HELLO = """{"name": "my solver", "version": "1.0", "method": "Dormand-Prince 5(4)"}"""

# The method of Dormand and Prince: a row for each evaluation after the first, the last at the new point, and what the
# new point has beyond that of order 4.
const ROWS = ((1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0),
              (3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0),
              (44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0),
              (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0),
              (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0),
              (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84))
const ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
const STEPS_MAX = 1_000_000

# Flies through one stage from time t, depth x and velocity v > 0 until x = limit (may be Inf) or V = 0. Returns t, x, v
# there: x is `limit` itself where that was reached, and v is 0.0 where the projectile came to rest.
function solve_stage(mass, p, s, r, q, limit, t, x, v, rtol, atol)
    acceleration(x, v) = -(p + s * x + (r + q * v) * v) / mass

    # From x, v, a on by h: depth, velocity and acceleration there, and the estimated error over the tolerance.
    function step(x, v, a, h)
        slope_x, slope_v = zeros(7), zeros(7)
        slope_x[1], slope_v[1] = v, a
        x1, v1 = x, v
        for (row, weights) in enumerate(ROWS)
            x1 = x + h * sum(weights[i] * slope_x[i] for i in 1:row)
            v1 = v + h * sum(weights[i] * slope_v[i] for i in 1:row)
            slope_x[row + 1], slope_v[row + 1] = v1, acceleration(x1, v1)
        end
        ex = h * sum(ERROR[i] * slope_x[i] for i in 1:7) / (atol[1] + rtol * abs(x1))
        ev = h * sum(ERROR[i] * slope_v[i] for i in 1:7) / (atol[2] + rtol * abs(v1))
        return x1, v1, slope_v[7], max(abs(ex), abs(ev))
    end

    # The step, h at most, at whose end a gap is closed that is open at its start: Newton within a bracket. `gap` gives
    # the gap and its derivative in time.
    function shorten(x, v, a, h, gap)
        low, high = 0.0, h
        x1, v1 = x, v
        for _ in 1:100
            x1, v1, a1, _ = step(x, v, a, h)
            open_by, rate = gap(x1, v1, a1)
            low, high = open_by > 0.0 ? (h, high) : (low, h)
            change = rate == 0.0 ? Inf : -open_by / rate
            if abs(change) <= 1e-16 * h || high - low <= 1e-16 * h
                break
            end
            h = low < h + change < high ? h + change : 0.5 * (low + high)
        end
        return h, x1, v1
    end

    a = acceleration(x, v)
    h = 0.01 * min((x + atol[1] / rtol) / v, a == 0.0 ? Inf : v / abs(a))
    for _ in 1:STEPS_MAX
        x1, v1, a1, err = step(x, v, a, h)
        factor = err < 1000.0 ? min(5.0, 0.9 * max(err, 1e-9)^-0.2) : 0.2
        if !(err <= 1.0)
            h *= factor
            continue
        end
        # A step over the turning point may begin and end before the limit and pass it twice: the turning point first.
        if v1 <= 0.0
            h, x1, v1 = shorten(x, v, a, h, (x1, v1, a1) -> (v1, a1))
            if x1 < limit
                return t + h, x1, 0.0
            end
        end
        if x1 >= limit
            h, x1, v1 = shorten(x, v, a, h, (x1, v1, a1) -> (limit - x1, -v1))
            return t + h, limit, max(v1, 0.0)
        end
        t, x, v, a, h = t + h, x1, v1, a1, h * factor
    end
    error("more than $STEPS_MAX steps in a stage")
end

# One flight: from stage to stage until rest or exit, every event on the way listed.
function solve(question)
    depth(value) = value === nothing ? Inf : value
    mass, v, exit_depth = question["mass_kg"], question["velocity_m_s"], depth(question["exit_depth_m"])
    t, x, outcome, events = 0.0, 0.0, "stopped", String[]
    numbers() = all(isfinite, (t, x, v)) ? "\"time_s\": $t, \"depth_m\": $x, \"velocity_m_s\": $v" :
                error("the answer is not finite")
    happened(event) = push!(events, "{\"event\": $event, $(numbers())}")

    for (index, stage) in enumerate(question["stages"])
        p, s, r, q = (stage[key] for key in ("static_force_n", "stiffness_n_m", "viscosity_kg_s", "drag_kg_m"))
        stage_end = depth(stage["end_m"])
        limit = min(stage_end, exit_depth)
        if x < limit && v > 0.0
            t, x, v = solve_stage(mass, p, s, r, q, limit, t, x, v, question["rtol"], Float64.(question["atol"]))
        end
        if x < limit
            break
        end
        if stage_end <= exit_depth
            happened("\"stage-end\", \"stage\": $(index - 1)")
        end
        if exit_depth <= stage_end
            happened("\"exit\"")
            outcome = "perforated"
            break
        end
    end
    if v == 0.0
        happened("\"rest\"")
    end
    return "\"outcome\": \"$outcome\", $(numbers()), \"events\": [$(join(events, ", "))]"
end

# The value of JSON at `place` in `text`, and the place behind it. It takes what is well formed; penetrode writes nothing else.
function parse_json(text, place = 1)
    skip(place) = something(findnext(c -> !(c in " \t\r\n,:"), text, place))
    place = skip(place)
    c = text[place]
    if c == '{' || c == '['
        keys, items = String[], Any[]
        place = skip(place + 1)
        while !(text[place] in "]}")
            if c == '{'
                key, place = parse_json(text, place)
                push!(keys, key)
            end
            item, place = parse_json(text, place)
            push!(items, item)
            place = skip(place)
        end
        return (c == '{' ? Dict{String,Any}(zip(keys, items)) : items), place + 1
    end
    m = match(r"\G(?:\"((?:[^\"\\]|\\.)*)\"|null|true|false|[-+0-9.eE]+)", text, place)
    m === nothing && error("this is not JSON")
    word, place = m.match, place + ncodeunits(m.match)
    value = word == "null" ? nothing : word == "true" ? true : word == "false" ? false :
            c == '"' ? String(m.captures[1]) : parse(Float64, word)
    return value, place
end

function answer(line)
    question, _ = parse_json(line)
    if haskey(question, "hello")
        return HELLO
    end
    id = Int(question["id"])
    try
        flight, times = "", Float64[]
        for _ in 1:question["repeats"]  # more than one only where `bench` measures the time
            start = time_ns()
            flight = solve(question)
            push!(times, time_ns() - start)
        end
        return "{\"id\": $id, $flight, \"wall_ns\": $(sort(times)[cld(end, 2)])}"
    catch problem  # said in the answer; the next question may be solved
        return "{\"id\": $id, \"error\": \"$(replace(sprint(showerror, problem), r"[\"\\\s]+" => " "))\"}"
    end
end

for line in eachline(stdin)
    println(answer(line))
    flush(stdout)
end
