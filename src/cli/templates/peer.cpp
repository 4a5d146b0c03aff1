// A solver of your own, asked by penetrode: it reads one question a line and answers one a line, both in JSON.
//
//     g++ -O2 -std=c++17 -o peer peer.cpp
//     penetrode diagnose ./peer                         what is wrong?
//     penetrode verify --only peer/user --peer ./peer   does it agree?
//
// It runs as it stands. YOUR INTEGRATOR GOES INTO `solve_stage`; all below it is the protocol and may stay as it is.
// SI units throughout. In each stage, with x counted from the impact face,
//
//     dx/dt = V,    M dV/dt = -(p + s x + r V + q V^2),    until V = 0, the end of the stage or the exit depth.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

// Who you are. A solver with steps of one size adds "fixed_step": true; each question then has the step to use, "dt_s",
// and rtol and atol mean nothing. One that computes its forces itself adds "reads": "scene"; each question then has the
// physical scene, "scene": mass_kg, diameter_m, strength_pa ...
const char* const HELLO = R"json({"name": "my solver", "version": "1.0", "method": "Dormand-Prince 5(4)"})json";

const double INF = std::numeric_limits<double>::infinity();
const int STEPS_MAX = 1000000;

// The method of Dormand and Prince: a row for each evaluation after the first, the last at the new point, and what the
// new point has beyond that of order 4.
const double ROWS[6][6] = {{1 / 5.},
                           {3 / 40., 9 / 40.},
                           {44 / 45., -56 / 15., 32 / 9.},
                           {19372 / 6561., -25360 / 2187., 64448 / 6561., -212 / 729.},
                           {9017 / 3168., -355 / 33., 46732 / 5247., 49 / 176., -5103 / 18656.},
                           {35 / 384., 0, 500 / 1113., 125 / 192., -2187 / 6784., 11 / 84.}};
const double ERROR[7] = {71 / 57600., 0, -71 / 16695., 71 / 1920., -17253 / 339200., 22 / 525., -1 / 40.};

struct State { double t, x, v; };
struct Stage { double mass, p, s, r, q; };
struct Tolerance { double relative, depth, velocity; };
struct Step { double x, v, a, error; };

// Flies through one stage from `at`, where v > 0, until x = limit (may be infinite) or V = 0. Returns the state there: x
// is `limit` itself where that was reached, and v is 0 where the projectile came to rest.
State solve_stage(const Stage& stage, double limit, State at, const Tolerance& tolerance) {
    auto acceleration = [&](double x, double v) {
        return -(stage.p + stage.s * x + (stage.r + stage.q * v) * v) / stage.mass;
    };
    double a = acceleration(at.x, at.v);
    // From `at` on by h: the state there, and the estimated error over the tolerance.
    auto step = [&](double h) {
        double slope_x[7] = {at.v}, slope_v[7] = {a}, error_x = 0, error_v = 0;
        Step next{};
        for (int row = 0; row < 6; ++row) {
            double dx = 0, dv = 0;
            for (int i = 0; i <= row; ++i) {
                dx += ROWS[row][i] * slope_x[i];
                dv += ROWS[row][i] * slope_v[i];
            }
            next.x = at.x + h * dx;
            next.v = slope_x[row + 1] = at.v + h * dv;
            next.a = slope_v[row + 1] = acceleration(next.x, next.v);
        }
        for (int i = 0; i < 7; ++i) {
            error_x += h * ERROR[i] * slope_x[i];
            error_v += h * ERROR[i] * slope_v[i];
        }
        error_x /= tolerance.depth + tolerance.relative * std::abs(next.x);
        error_v /= tolerance.velocity + tolerance.relative * std::abs(next.v);
        next.error = std::max(std::abs(error_x), std::abs(error_v));
        return next;
    };
    // The step, h at most, at whose end a gap is closed that is open at its start: Newton within a bracket. `gap` gives
    // the gap and its derivative in time.
    auto shorten = [&](double& h, auto gap) {
        double low = 0, high = h;
        Step next{};
        for (int count = 0; count < 100; ++count) {
            next = step(h);
            auto [open_by, rate] = gap(next);
            (open_by > 0 ? low : high) = h;
            double change = rate != 0 ? -open_by / rate : INF;
            if (std::abs(change) <= 1e-16 * h || high - low <= 1e-16 * h) break;
            h = low < h + change && h + change < high ? h + change : 0.5 * (low + high);
        }
        return next;
    };

    double h = 0.01 * std::min((at.x + tolerance.depth / tolerance.relative) / at.v, a != 0 ? at.v / std::abs(a) : INF);
    for (int count = 0; count < STEPS_MAX; ++count) {
        Step next = step(h);
        double factor = next.error < 1000 ? std::min(5., 0.9 * std::pow(std::max(next.error, 1e-9), -0.2)) : 0.2;
        if (!(next.error <= 1)) {
            h *= factor;
            continue;
        }
        // A step over the turning point may begin and end before the limit and pass it twice: the turning point first.
        if (next.v <= 0) {
            next = shorten(h, [](const Step& s) { return std::pair(s.v, s.a); });
            if (next.x < limit) return {at.t + h, next.x, 0};
        }
        if (next.x >= limit) {
            next = shorten(h, [&](const Step& s) { return std::pair(limit - s.x, -s.v); });
            return {at.t + h, limit, std::max(next.v, 0.)};
        }
        at = {at.t + h, next.x, next.v};
        a = next.a;
        h *= factor;
    }
    throw std::runtime_error("more than " + std::to_string(STEPS_MAX) + " steps in a stage");
}

// A value of JSON. Its reader takes what is well formed; penetrode writes nothing else.
struct Json {
    char kind = 'n';  // null, true, false, digit, string, [ or {
    double number = 0;
    std::string text;
    std::vector<std::string> keys;
    std::vector<Json> items;

    explicit Json(const char*& at) {
        auto skip = [&] { while (*at && std::string(" \t\r\n,:").find(*at) != std::string::npos) ++at; };
        skip();
        kind = *at;
        if (kind == '[' || kind == '{') {
            for (++at, skip(); *at && *at != ']' && *at != '}'; skip()) {
                if (kind == '{') keys.push_back(Json(at).text);
                items.emplace_back(at);
            }
            if (*at) ++at;
        } else if (kind == '"') {
            for (++at; *at && *at != '"'; ++at) text += *at == '\\' && at[1] ? *++at : *at;
            if (*at) ++at;
        } else if (kind == 'n' || kind == 't' || kind == 'f') {
            while (*at >= 'a' && *at <= 'z') ++at;
        } else {
            char* end = nullptr;
            number = std::strtod(at, &end);
            if (end == at) throw std::runtime_error("this is not JSON");
            kind = 'd';
            at = end;
        }
    }
    const Json* find(const char* key) const {
        auto place = std::find(keys.begin(), keys.end(), key);
        return place == keys.end() ? nullptr : &items[place - keys.begin()];
    }
    double at(const char* key) const {
        const Json* value = find(key);
        if (!value || value->kind != 'd') throw std::runtime_error(std::string(key) + " is not a number");
        return value->number;
    }
    double depth(const char* key) const { return find(key) && find(key)->kind == 'n' ? INF : at(key); }
    const std::vector<Json>& list(const char* key) const {
        if (!find(key) || find(key)->kind != '[') throw std::runtime_error(std::string(key) + " is not a list");
        return find(key)->items;
    }
};

std::string numbers(const State& at) {
    if (!std::isfinite(at.t + at.x + at.v)) throw std::runtime_error("the answer is not finite");
    char text[120];
    std::snprintf(text, sizeof text, R"("time_s": %.17g, "depth_m": %.17g, "velocity_m_s": %.17g)", at.t, at.x, at.v);
    return text;
}

// One flight: from stage to stage until rest or exit, every event on the way listed.
std::string solve(const Json& question) {
    const std::vector<Json>&atol = question.list("atol"), &stages = question.list("stages");
    const Tolerance tolerance{question.at("rtol"), atol.at(0).number, atol.at(1).number};
    const double exit_depth = question.depth("exit_depth_m");
    State at{0, 0, question.at("velocity_m_s")};
    std::string events, outcome = "stopped";
    auto happened = [&](const std::string& event) {
        events += (events.empty() ? "" : ", ") + ("{\"event\": " + event + ", ") + numbers(at) + "}";
    };
    for (std::size_t index = 0; index < stages.size(); ++index) {
        const Json& stage = stages[index];
        const double end = stage.depth("end_m"), limit = std::min(end, exit_depth);
        if (at.x < limit && at.v > 0)
            at = solve_stage({question.at("mass_kg"), stage.at("static_force_n"), stage.at("stiffness_n_m"),
                              stage.at("viscosity_kg_s"), stage.at("drag_kg_m")}, limit, at, tolerance);
        if (at.x < limit) break;
        if (end <= exit_depth) happened("\"stage-end\", \"stage\": " + std::to_string(index));
        if (exit_depth <= end) {
            happened("\"exit\"");
            outcome = "perforated";
            break;
        }
    }
    if (at.v == 0) happened("\"rest\"");
    return "\"outcome\": \"" + outcome + "\", " + numbers(at) + ", \"events\": [" + events + "]";
}

int main() {
    for (std::string line; std::getline(std::cin, line);) {
        std::string answer = HELLO, id = "null";
        try {
            const char* text = line.c_str();
            const Json question(text);
            if (!question.find("hello")) {
                id = std::to_string(static_cast<long long>(question.at("id")));
                std::vector<double> times;
                for (int count = static_cast<int>(question.at("repeats")); count > 0; --count) {  // 1 but for `bench`
                    const auto start = std::chrono::steady_clock::now();
                    answer = solve(question);
                    times.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
                }
                std::sort(times.begin(), times.end());
                answer = "{\"id\": " + id + ", " + answer + ", \"wall_ns\": " + std::to_string(times.at(times.size() / 2)) + "}";
            }
        } catch (const std::exception& error) {  // said in the answer; the next question may be solved
            answer = "{\"id\": " + id + ", \"error\": \"" + error.what() + "\"}";
        }
        std::cout << answer << std::endl;
    }
}
