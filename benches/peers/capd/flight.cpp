// Flights of polynomial stages in enclosures of CAPD: M dV/dt = -(p + s x + r V + q V²), stage by stage.
//
// One scene a line on standard input, every number as two, low and high:
//
//     NAME REPEATS M V0 H COUNT (p s r q end) ...        an H or an end that there is not: inf inf
//
// One JSON object a line on standard output: events with intervals of time, depth and velocity, the outcome, and the least
// time of a flight in microseconds. The end of a stage and the far side are sections x = end, rest is the section V = 0.
// Which of the two comes first is guessed in plain numbers and then proved: by V > 0 at the end, where F >= 0 lets V only fall
// (of the driven stage of `stiff` V' > 0 at V = 0), or by a depth of rest in front of the end. Where CAPD refuses to cross
// x = end, the depth of rest of the same force decides whether it lies beyond.

#include <chrono>
#include <cstdio>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "capd/capdlib.h"

#ifndef CAPD_SOURCE
#define CAPD_SOURCE "CAPD, version not given"
#endif

using capd::interval;
using capd::IVector;

struct Stage {
    interval p, s, r, q, end;
    bool has_end;
};

struct Scene {
    std::string name;
    int repeats;
    interval mass, speed;
    std::vector<Stage> stages;
    int last;  // the stage that ends at the far side, or -1
};

struct Event {
    std::string kind;
    int stage;
    interval time, depth, velocity;
};

struct Flight {
    std::string outcome = "undecided", refused;
    std::vector<Event> events;
};

static double number(std::istream &in) {
    std::string word;
    if (!(in >> word)) throw std::runtime_error("a line is too short");
    return std::strtod(word.c_str(), nullptr);
}

static interval pair(std::istream &in, bool *is_finite = nullptr) {
    double low = number(in), high = number(in);
    bool finite = high < std::numeric_limits<double>::infinity();
    if (is_finite) *is_finite = finite;
    return finite ? interval(low, high) : interval(0.0);
}

static Scene read(const std::string &line) {
    std::istringstream in(line);
    Scene scene;
    int count;
    in >> scene.name >> scene.repeats;
    scene.mass = pair(in), scene.speed = pair(in);
    bool has_exit;
    interval exit = pair(in, &has_exit);
    in >> count;
    scene.last = -1;
    for (int i = 0; i < count; i++) {
        Stage stage;
        stage.p = pair(in), stage.s = pair(in), stage.r = pair(in), stage.q = pair(in);
        stage.end = pair(in, &stage.has_end);
        if (has_exit && scene.last < 0 && (!stage.has_end || stage.end.rightBound() >= exit.leftBound())) {
            scene.last = i;
            stage.end = exit, stage.has_end = true;
        }
        scene.stages.push_back(stage);
    }
    return scene;
}

/// What is guessed of a stage: whether V vanishes in front of its end, how long it takes, and the share of that which a step may
/// take at most, where CAPD refuses its own steps.
struct Guess {
    bool rests;
    double time, share;
};

/// A guess, by Heun steps.
static Guess guess(const Stage &stage, double mass, double x, double v) {
    double p = stage.p.mid().leftBound(), s = stage.s.mid().leftBound(), r = stage.r.mid().leftBound();
    double q = stage.q.mid().leftBound(), time = 0;
    double end = stage.has_end ? stage.end.mid().leftBound() : std::numeric_limits<double>::infinity();
    auto slowed = [&](double x, double v) { return -(p + s * x + r * v + q * v * v) / mass; };
    for (long step = 0; step < 2000000; step++) {
        double h = 1e-3 * std::min((end - x) / v + 1e-9, mass * v / std::abs(slowed(x, v) * mass + 1e-300) + 1e-12);
        h = std::max(h, 1e-9);
        double a = slowed(x, v), b = slowed(x + h * v, v + h * a);
        x += h * (v + 0.5 * h * a), v += 0.5 * h * (a + b), time += h;
        if (v <= 0 || x >= end) return {v <= 0, time, 0};
    }
    return {false, time, 0};
}

/// A vector field and its solver, made once and used for every stage.
struct Solver {
    capd::IMap field{"par:m,p,s,r,q;var:x,v;fun:v,-(p+s*x+r*v+q*v^2)/m;"};
    capd::IOdeSolver solver{field, 20};
    capd::ICoordinateSection at_end{2, 0}, at_rest{2, 1};
    capd::IPoincareMap to_end{solver, at_end, capd::poincare::MinusPlus};
    capd::IPoincareMap to_rest{solver, at_rest, capd::poincare::PlusMinus};

    void stage(const Stage &stage, const interval &mass) {
        field.setParameter("m", mass), field.setParameter("p", stage.p), field.setParameter("s", stage.s);
        field.setParameter("r", stage.r), field.setParameter("q", stage.q);
    }

    /// State and duration at the section of `map`, in steps that CAPD chooses, or no longer than a share of the time.
    IVector reach(capd::IPoincareMap &map, const IVector &from, interval &duration, Guess &guess) {
        for (;; guess.share = guess.share == 0 ? 0.125 : guess.share / 8) {
            try {
                solver.setMaxStep(guess.share == 0 ? 1e10 : guess.share * guess.time);
                map.setMaxReturnTime(4 * guess.time);
                capd::C0HORect2Set set(from);
                duration = interval(0.0);
                return map(set, duration);
            } catch (const std::exception &) {
                if (guess.share != 0 && guess.share < SHARE_MIN) throw;
            }
        }
    }

    static constexpr double SHARE_MIN = 1e-3;
};

/// The flight; `guesses`, one a stage, are filled in where there are none.
static Flight fly(const Scene &scene, Solver &solver, std::vector<Guess> &guesses) {
    Flight flight;
    IVector state(2);
    state[0] = interval(0.0), state[1] = scene.speed;
    interval time(0.0);
    for (int i = 0; i < int(scene.stages.size()); i++) {
        const Stage &stage = scene.stages[i];
        solver.stage(stage, scene.mass);
        if (int(guesses.size()) <= i) {
            double x = state[0].mid().leftBound(), v = state[1].mid().leftBound();
            guesses.push_back(guess(stage, scene.mass.mid().leftBound(), x, v));
        }
        interval duration;
        try {
            if (guesses[i].rests) {
                IVector there = solver.reach(solver.to_rest, state, duration, guesses[i]);
                if (stage.has_end && !(there[0].rightBound() < stage.end.leftBound())) {
                    flight.refused = "the depth of rest meets the end";
                    return flight;
                }
                flight.events.push_back({"rest", i, time + duration, there[0], interval(0.0)});
                flight.outcome = "stopped";
                return flight;
            }
            solver.at_end.setConstant(stage.end);
            IVector there = solver.reach(solver.to_end, state, duration, guesses[i]);
            if (!(there[1].leftBound() > 0)) throw std::runtime_error("V at the end may vanish");
            time += duration;
            state[0] = stage.end, state[1] = there[1];
        } catch (const std::exception &error) {
            flight.refused = error.what();
            if (guesses[i].rests || i != scene.last) return flight;
            try {
                Guess anew{true, guesses[i].time, 0};
                IVector there = solver.reach(solver.to_rest, state, duration, anew);
                if (there[0].leftBound() > stage.end.rightBound()) flight.outcome = "perforated";
            } catch (const std::exception &) {
            }
            return flight;
        }
        bool is_exit = i == scene.last;
        flight.events.push_back({is_exit ? "exit" : "end", i, time, stage.end, state[1]});
        if (is_exit) {
            flight.outcome = "perforated";
            return flight;
        }
    }
    return flight;
}

static void print(const char *name, const interval &value) {
    std::printf(",\"%s\":[%.17g,%.17g]", name, value.leftBound(), value.rightBound());
}

int main(int count, char **words) {
    if (count > 1 && std::string(words[1]) == "--version") {
        std::puts(CAPD_SOURCE);
        return 0;
    }
    Solver solver;
    std::string line;
    while (std::getline(std::cin, line)) {
        if (line.empty()) continue;
        Scene scene = read(line);
        std::vector<Guess> guesses;
        Flight flight = fly(scene, solver, guesses);
        double least = std::numeric_limits<double>::infinity();
        for (int i = 0; i < scene.repeats; i++) {
            auto start = std::chrono::steady_clock::now();
            Flight again = fly(scene, solver, guesses);
            std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
            least = std::min(least, took.count());
        }
        std::string refused = flight.refused.substr(0, flight.refused.find('\n'));
        for (char &c : refused) if (c == '"' || c == '\\' || c < ' ') c = ' ';
        std::printf("{\"name\":\"%s\",\"outcome\":\"%s\",\"refused\":\"%s\",\"microseconds\":%.2f,\"events\":[", scene.name.c_str(),
                    flight.outcome.c_str(), refused.c_str(), scene.repeats ? least : 0.0);
        for (size_t i = 0; i < flight.events.size(); i++) {
            const Event &event = flight.events[i];
            std::printf("%s{\"event\":\"%s\",\"stage\":%d", i ? "," : "", event.kind.c_str(), event.stage);
            print("time_s", event.time), print("depth_m", event.depth), print("velocity_m_s", event.velocity);
            std::printf("}");
        }
        std::printf("]}\n");
        std::fflush(stdout);
    }
}
