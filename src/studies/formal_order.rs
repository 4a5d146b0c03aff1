//! Which order of convergence is to be expected: the table of `docs/theory.md`, section 5, as a function.
//!
//! "The order of the method" has no single value. It belongs to the velocity rule, the boundary rule, the path and the
//! quantity: the same scheme is of second order in the depth, of first order in the time, and of first order in both
//! as soon as a lagged drag acts. A measured order is judged against this function, degraded orders included.

use super::quantity::Quantity;
#[cfg(doc)]
use crate::integrators::central_difference::Steps;
use crate::integrators::{Boundaries, Flight, VelocityAt};
use crate::physics::{EventKind, Law, Outcome, Problem, State};

/// Largest jump of the force at a stage end, relative to the force, that still counts as continuous.
///
/// A continuous crater constant closes the gap to a few ulp times the condition of V1²; a real jump of this size
/// would lower an order only where the error is below a millionth of what the step leaves anyway.
const CONTINUOUS: f64 = 1e-9;

/// What happens on the path to a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stretch {
    /// The force of a stage on the path depends on the velocity.
    pub velocity_dependent: bool,
    /// The force jumps at a stage end on the path. A stage end at the place itself does not count.
    pub force_jumps: bool,
    /// The order to which a law limits all quantities, where its force has no slope at an end of its stage or at a kink.
    pub of_sharp_end: Option<f64>,
    /// The same of the place itself, where the last step alone is wrong: the order of the velocity there.
    pub of_sharp_place: Option<f64>,
}

/// The facts about a flight that decide the order of a fixed-step scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Path {
    /// Whether the flight leaves the target.
    pub perforates: bool,
    /// The path to x = k d, if the flight reaches it.
    pub to_crater_end: Option<Stretch>,
    /// The whole path.
    pub to_end: Stretch,
    /// The order to which the law of the last stage limits the time of rest, where its force is not smooth in V there.
    pub time_of_rest: Option<f64>,
    /// The power n of V with which the force of the last stage grows from that at rest, where [`Steps::Automatic`] grow as
    /// `1/V^(n-1)` towards rest: no spring and no viscosity limits them there.
    pub growing_steps: Option<f64>,
}

/// The order of the time of rest under a law that is not smooth in V there, below 2.
///
/// `F = a V^n`, n < 1: rescaled by `V -> l V, t -> l^(1-n) t` the last steps are the same for every size h, so that they leave a
/// share of h in the time. `F = F0 + a V^n`, F0 > 0: V falls evenly, and the last step has F wrong by `h^n`.
fn time_of_rest(law: &Law, depth: f64, speed: f64) -> Option<f64> {
    let at_rest = law.force_value(depth, 0.0);
    let power = sharp_power(|v| law.force_value(depth, v) - at_rest, NEAR * speed)?;
    Some(if at_rest == 0.0 { 1.0 } else { 1.0 + power })
}

/// [`Path::growing_steps`] where stage `stage` ends at rest at `depth`.
fn growing_steps(problem: &Problem, stage: usize, depth: f64) -> Option<f64> {
    let linear = problem.linear(stage, State { time: 0.0, depth, velocity: 0.0 });
    let at_rest = problem.force(stage, depth, 0.0);
    if linear.stiffness > 0.0 || linear.viscosity > 0.0 || at_rest <= 0.0 {
        return None;
    }
    let Some(law) = problem.laws.of(stage) else { return (linear.drag > 0.0).then_some(2.0) };
    let excess = |v: f64| law.force_value(depth, v) - at_rest;
    // Near enough for the leading power, and far enough for it to stand above the rounding of the force at rest.
    let near = GROWING * problem.impact_speed;
    let power = (excess(near) / excess(0.5 * near)).log2();
    (power > 1.0 / SMOOTH).then_some(power)
}

/// A law on the way through its stage, where V² is taken to fall evenly from one place to the other.
struct Way<'a> {
    law: &'a Law,
    from: State,
    to: State,
}

impl Way<'_> {
    fn length(&self) -> f64 {
        self.to.depth - self.from.depth
    }

    fn velocity(&self, depth: f64) -> f64 {
        let [from, to] = [self.from, self.to].map(|state| state.velocity * state.velocity);
        (from + (to - from) * (depth - self.from.depth) / self.length()).max(0.0).sqrt()
    }

    fn force(&self, depth: f64) -> f64 {
        self.law.force_value(depth, self.velocity(depth))
    }

    /// The order, below 2, to which the law limits the velocity behind `depth`, where its force has no slope on one `side` of it.
    ///
    /// `F = F0 + a x^n`, n < 1, is passed at a velocity: it grows as `t^n`, of which sums over steps are wrong by `h^(1+n)`. Where
    /// the projectile comes to rest x is flat, and no more is lost than in a smooth force.
    fn order_beside(&self, depth: f64, side: f64, speed: f64) -> Option<f64> {
        let (force, near) = (self.force(depth), NEAR * side * self.length());
        let excess = |x: f64| self.force(depth + x) - force;
        let power = sharp_power(excess, near)?;
        // A slope that is lost in the roundings of the force is none.
        let is_seen = excess(near).abs() > CONTINUOUS * force.abs();
        (is_seen && self.velocity(depth) > SLOW * speed).then_some(1.0 + power)
    }

    /// Depths inside at which `min`, `max` or `abs` in the law change sides.
    fn kinks(&self) -> Vec<f64> {
        let Some(bound) = self.law.bound().filter(|bound| !bound.switches().is_empty()) else { return Vec::new() };
        let sides = |depth: f64| bound.sides(depth, self.velocity(depth));
        let place = |part: usize| self.from.depth + self.length() * part as f64 / PARTS as f64;
        let parts = (0..PARTS).map(|part| (place(part), place(part + 1)));
        parts
            .filter(|(low, high)| sides(*low) != sides(*high))
            .map(|(mut low, mut high)| {
                for _ in 0..f64::MANTISSA_DIGITS {
                    let middle = 0.5 * (low + high);
                    *(if sides(middle) == sides(low) { &mut low } else { &mut high }) = middle;
                }
                high
            })
            .filter(|depth| *depth < self.to.depth)
            .collect()
    }
}

/// The power to which `excess` grows from zero, below 1 and so that it has no slope there; as much of it as `near` shows.
fn sharp_power(excess: impl Fn(f64) -> f64, near: f64) -> Option<f64> {
    let power = (excess(near) / excess(0.5 * near)).log2();
    (power > 0.0 && power < SMOOTH).then_some(power)
}

/// Share of the impact speed, or of the length of a stage, at which the power of a force is taken: what is steep and smooth has a
/// slope there.
const NEAR: f64 = 1e-7;

/// Share of the impact speed at which the power of a force is taken above that at rest.
const GROWING: f64 = 1e-3;

/// The power from which on a force has a slope.
const SMOOTH: f64 = 0.9999;

/// Share of the impact speed below which a place is no longer passed.
const SLOW: f64 = 1e-4;

/// Parts of a stage in which kinks of its force are looked for.
const PARTS: usize = 512;

impl Path {
    /// The facts about `flight`, an accurate flight (closed form, Taylor) through `problem` with its events.
    pub fn of(problem: &Problem, flight: &Flight) -> Self {
        // Stages of no length leave no trace.
        let mut behind = None;
        let ends: Vec<(usize, State)> = flight
            .events
            .iter()
            .filter_map(|event| {
                let index = match event.kind {
                    EventKind::StageEnd(index) => index,
                    EventKind::CraterEnd => problem.crater?,
                    EventKind::Plug => behind.map_or(0, |index| index + 1),
                    EventKind::Exit | EventKind::Rest => return None,
                };
                behind = Some(index);
                Some((index, event.state))
            })
            .collect();
        let crossed: Vec<usize> = if problem.laws.have_conditions() {
            // Where they end, the flight tells.
            let mut start = 0.0;
            let passed = ends.iter().filter(|(_, at)| std::mem::replace(&mut start, at.depth) < at.depth);
            passed.map(|(index, _)| *index).chain([flight.stage]).collect()
        } else {
            (0..=flight.stage).filter(|&index| problem.stages[index].end > problem.start_of(index)).collect()
        };
        let stretch = |last: usize| {
            let mut stretch = Stretch::default();
            for (turn, &index) in crossed.iter().enumerate().take_while(|(_, index)| **index <= last) {
                let law = &problem.stages[index];
                let own = problem.laws.of(index);
                stretch.velocity_dependent |=
                    own.map_or(law.viscosity > 0.0 || law.drag > 0.0, Law::depends_on_velocity);
                let end_of = |index: usize| ends.iter().find(|(end, _)| *end == index).map(|(_, state)| *state);
                let entry = turn.checked_sub(1).and_then(|before| end_of(crossed[before]));
                if let Some(law) = own {
                    let from = entry.unwrap_or(State::at_impact(problem));
                    let end = end_of(index).or((flight.outcome == Outcome::Perforated).then_some(flight.end));
                    let way = Way { law, from, to: end.unwrap_or(flight.end) };
                    let beside = |depth: f64, side: f64| way.order_beside(depth, side, problem.impact_speed);
                    let behind = end.and_then(|end| beside(end.depth, -1.0));
                    let (inside, place) = if index == last { (None, behind) } else { (behind, None) };
                    let kinks = way.kinks().into_iter().flat_map(|depth| [-1.0, 1.0].map(|side| beside(depth, side)));
                    let sharp =
                        kinks.flatten().chain(beside(from.depth, 1.0)).chain(inside).chain(stretch.of_sharp_end);
                    stretch.of_sharp_end = sharp.min_by(f64::total_cmp);
                    stretch.of_sharp_place = place;
                }
                if let Some(state) = entry {
                    let behind = crossed[turn - 1];
                    let left = problem.force(behind, state.depth, state.velocity);
                    let right = problem.force(index, state.depth, state.velocity);
                    // A mass that joins lets the velocity jump.
                    let joins = problem.laws.of(index).is_some_and(|law| law.joining(state.depth).is_some());
                    stretch.force_jumps |= joins || (left - right).abs() > CONTINUOUS * left.abs().max(right.abs());
                }
            }
            stretch
        };
        Self {
            perforates: flight.outcome == Outcome::Perforated,
            to_crater_end: flight.crater_end().and(problem.crater).map(stretch),
            to_end: stretch(flight.stage),
            time_of_rest: problem
                .laws
                .of(flight.stage)
                .filter(|_| flight.outcome.is_stop())
                .and_then(|law| time_of_rest(law, flight.end.depth, problem.impact_speed)),
            growing_steps: flight
                .events
                .last()
                .filter(|event| event.kind == EventKind::Rest)
                .and_then(|rest| growing_steps(problem, flight.stage, rest.state.depth)),
        }
    }

    /// The order over the safety factor S of [`Steps::Automatic`] of a quantity whose order in equal steps is `order`.
    ///
    /// Where the force at rest is F0 and grows by `a V^n`, n > 1, the steps are as `S/V^(n-1)`, and the last one, which takes V
    /// to rest, has `V ~ dt ~ S^(1/n)`. It has the force wrong by `V^n` and so the time by `S^(1 + 1/n)`; a time that is not
    /// interpolated is off by dt, and the depth then by V dt. An interpolated depth is of second order but for a logarithm.
    pub fn in_automatic_steps(&self, order: f64, boundaries: Boundaries, quantity: Quantity) -> f64 {
        let Some(n) = self.growing_steps else { return order };
        let is_late = boundaries == Boundaries::StepEnd;
        order.min(match quantity {
            Quantity::Time if is_late => 1.0 / n,
            Quantity::Time => 1.0 + 1.0 / n,
            Quantity::Depth | Quantity::CriticalVelocity if is_late => 2.0 / n,
            _ => order,
        })
    }
}

/// Formal order in dt of `quantity` for central difference; `None` for a quantity that the flight fixes or does not
/// have (the depth of a perforation, the velocity at rest, the crater's end if it is not reached).
///
/// | reason | orders |
/// |---|---|
/// | none of the below | 2 |
/// | `lagged`, force depends on the velocity before the quantity is taken | 1 |
/// | force jumps on the path and is not landed on | 1 |
/// | `step-end`: time and velocity are taken up to one step late | 1 |
/// | `step-end`: the depth at rest, which is flat there | 2 |
/// | not landed, force jumps at x = k d: the velocity there is interpolated over the jump | 1, its time 2 |
/// | the force goes as `V^n`, n < 1, towards rest: its time | 1, beside a force at rest 1 + n |
/// | the force goes as `x^n`, n < 1, from an end of its stage or a kink that is passed | 1 + n; if that is the place itself, its velocity alone |
///
/// The critical velocity has the order of the depth at rest. `path` is then that of the critical flight, whatever it
/// says about leaving the target.
pub fn formal_order(velocity: VelocityAt, boundaries: Boundaries, path: &Path, quantity: Quantity) -> Option<f64> {
    let stretch = match quantity {
        Quantity::Depth if path.perforates => None,
        Quantity::Velocity if !path.perforates => None,
        Quantity::Depth | Quantity::Time | Quantity::Velocity | Quantity::CriticalVelocity => Some(path.to_end),
        Quantity::CraterEndTime => path.to_crater_end,
        // The velocity is interpolated with the force of the far side, if the flight goes there.
        Quantity::CraterEndVelocity => {
            path.to_crater_end.map(|stretch| Stretch { force_jumps: path.to_end.force_jumps, ..stretch })
        }
    }?;
    let lags = velocity == VelocityAt::LaggedHalfStep && stretch.velocity_dependent;
    let misses_jump = boundaries != Boundaries::Landed && stretch.force_jumps;
    let late = boundaries == Boundaries::StepEnd && !matches!(quantity, Quantity::Depth | Quantity::CriticalVelocity);
    let of_rest = path.time_of_rest.filter(|_| quantity == Quantity::Time);
    let of_place =
        stretch.of_sharp_place.filter(|_| matches!(quantity, Quantity::Velocity | Quantity::CraterEndVelocity));
    let sharp = of_rest.into_iter().chain(stretch.of_sharp_end).chain(of_place).fold(2.0, f64::min);
    Some(if lags || misses_jump || late { 1.0 } else { sharp })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on should stop")]
mod tests {
    use super::*;
    use crate::integrators::central_difference::tests::{DRAG as Q, SPEED, combinations, concrete};
    use crate::integrators::{CentralDifference, Cost, Integrator, Taylor};
    use crate::physics::{Event, Stage, State};
    use crate::studies::convergence::{FixedSteps, STEPS_OVER_TIME, of_fixed_steps};
    use crate::studies::error::Truth;
    use crate::testing::scene;

    /// Depth, time, velocity at the end; time and velocity at k d.
    type Row = [Option<f64>; 5];

    fn row(velocity: VelocityAt, boundaries: Boundaries, path: Path) -> Row {
        use Quantity::{CraterEndTime, CraterEndVelocity, Depth, Time, Velocity};
        [Depth, Time, Velocity, CraterEndTime, CraterEndVelocity].map(|q| formal_order(velocity, boundaries, &path, q))
    }

    const PLAIN: Stretch =
        Stretch { velocity_dependent: false, force_jumps: false, of_sharp_end: None, of_sharp_place: None };
    const DRAGGED: Stretch = Stretch { velocity_dependent: true, ..PLAIN };
    const CRATER: Path =
        Path { perforates: false, to_crater_end: None, to_end: PLAIN, time_of_rest: None, growing_steps: None };
    const TUNNEL: Path = Path { to_crater_end: Some(PLAIN), ..CRATER };
    const DRAG: Path = Path { to_end: DRAGGED, ..TUNNEL };

    fn with_jump(path: Path) -> Path {
        Path { to_end: Stretch { force_jumps: true, ..path.to_end }, ..path }
    }

    /// Without lag a continuous force is second order; what is taken at the end of a step is first.
    #[test]
    fn orders_follow_from_the_rules_and_the_path() {
        let (one, two) = (Some(1.0), Some(2.0));
        for (velocity, boundaries) in combinations() {
            let taken = if boundaries == Boundaries::StepEnd { one } else { two };
            let row = |path| row(velocity, boundaries, path);
            assert_eq!(row(CRATER), [two, taken, None, None, None], "rest in the crater: {velocity}, {boundaries}");
            for path in [TUNNEL, DRAG] {
                let said = format!("{velocity}, {boundaries}, {path:?}");
                let lags = velocity == VelocityAt::LaggedHalfStep && path.to_end.velocity_dependent;
                if lags {
                    // First order, but not at the end of a crater without drag.
                    assert_eq!(row(path), [one, one, None, taken, taken], "{said}");
                } else {
                    assert_eq!(row(path), [two, taken, None, taken, taken], "{said}");
                    assert_eq!(row(Path { perforates: true, ..path }), [None, taken, taken, taken, taken], "{said}");
                }
                // A jump of the force keeps the order only where it is landed on.
                let jumped = match boundaries {
                    Boundaries::StepEnd => [one, one, None, one, one],
                    Boundaries::Interpolated => [one, one, None, two, one],
                    Boundaries::Landed if lags => [one, one, None, two, two],
                    Boundaries::Landed => [two, two, None, two, two],
                };
                assert_eq!(row(with_jump(path)), jumped, "{said}, with a jump");
            }
            for path in [DRAG, with_jump(DRAG)] {
                let depth = formal_order(velocity, boundaries, &path, Quantity::Depth);
                let through = Path { perforates: true, ..path };
                let critical = formal_order(velocity, boundaries, &through, Quantity::CriticalVelocity);
                assert_eq!(critical, depth, "the critical velocity has the order of the depth at rest");
            }
        }
        let viscous_crater = Path { to_crater_end: Some(DRAGGED), ..DRAG };
        assert_eq!(row(VelocityAt::LaggedHalfStep, Boundaries::Landed, viscous_crater)[4], one);
    }

    /// A flight that ended in stage `stage`, with `events` at these depths and velocities.
    fn flight(outcome: Outcome, stage: usize, events: &[(EventKind, f64, f64)]) -> Flight {
        let state = |depth, velocity| State { time: 0.0, depth, velocity };
        Flight {
            outcome,
            stage,
            end: state(0.0, 0.0),
            events: events.iter().map(|&(kind, x, v)| Event { kind, state: state(x, v) }).collect(),
            exit_margin: None,
            exit_margin_error: None,
            cost: Cost::default(),
            trajectory: Vec::new(),
            step_limit: None,
            notes: Vec::new(),
        }
    }

    fn small(stiffness: f64, drag: f64) -> Problem {
        Problem::crater_and_tunnel(1.0, 4.0, Some(Stage::crater(stiffness, 0.5)), Stage::tunnel(2.0, drag))
    }

    #[test]
    fn the_facts_of_a_path_are_read_from_the_stages_it_crosses() {
        use EventKind::{CraterEnd, Exit, Rest};
        // c k d = 6 = P + Q V1² with Q = 1, V1 = 2: continuous.
        let stop = flight(Outcome::StoppedInTunnel, 1, &[(CraterEnd, 0.5, 2.0), (Rest, 1.0, 0.0)]);
        let to_rest = Path { growing_steps: Some(2.0), ..DRAG };
        assert_eq!(Path::of(&small(12.0, 1.0), &stop), to_rest);
        assert_eq!(Path::of(&small(12.1, 1.0), &stop), with_jump(to_rest));
        assert_eq!(Path::of(&small(4.0, 0.0), &stop), TUNNEL);
        let through = flight(Outcome::Perforated, 1, &[(CraterEnd, 0.5, 2.0), (Exit, 0.6, 1.0)]);
        assert_eq!(Path::of(&small(12.0, 1.0), &through), Path { perforates: true, ..DRAG });
        // A stop in the crater knows nothing of the tunnel, nor does one that just touches its end.
        let short = flight(Outcome::StoppedInCrater, 0, &[(Rest, 0.4, 0.0)]);
        assert_eq!(Path::of(&small(12.1, 1.0), &short), CRATER);
        let touch = flight(Outcome::StoppedInCrater, 0, &[(CraterEnd, 0.5, 0.0), (Rest, 0.5, 0.0)]);
        assert_eq!(Path::of(&small(12.1, 1.0), &touch), Path { to_crater_end: Some(PLAIN), ..CRATER });
    }

    #[test]
    fn a_stage_of_no_length_leaves_no_trace() {
        use EventKind::{Rest, StageEnd};
        let wall = Stage { static_force: 1e9, viscosity: 1.0, ..Stage::crater(0.0, 0.5) };
        let soft = Stage { static_force: 2.0, ..Stage::crater(0.0, 0.5) };
        let problem = Problem::of_stages(1.0, 4.0, [soft, wall, Stage::tunnel(2.0, 0.0)]);
        let events = [(StageEnd(0), 0.5, 2.0), (StageEnd(1), 0.5, 2.0), (Rest, 1.0, 0.0)];
        assert_eq!(Path::of(&problem, &flight(Outcome::Stopped, 2, &events)), CRATER);
    }

    #[test]
    fn orders_at_an_exit_inside_the_crater_are_the_formal_ones() {
        // The suite has a claim for each of the other paths.
        let problem = concrete(Q, 1.0, SPEED, 0.06);
        let exact = Truth::of(&problem).unwrap().flight;
        let [from, to] = STEPS_OVER_TIME.map(|share| share * exact.end.time);
        for (velocity, boundaries) in combinations() {
            let scheme = |size| CentralDifference::uniform(size, velocity, boundaries);
            let study = FixedSteps {
                scheme: &scheme,
                range: Some([from, to]),
                points: 60,
                seed: 1,
                with_critical: false,
                progress: &|_, _| {},
            };
            let studies = of_fixed_steps(&scene(), &problem, &exact, &study).unwrap().quantities;
            assert_eq!(studies.len(), 2, "time and velocity");
            for study in studies {
                let (order, formal) = (study.fit.unwrap().line.unwrap().order, study.formal.unwrap());
                // No stage end is landed on here: the place of the exit in the step is a noise.
                let band = if boundaries == Boundaries::StepEnd { 0.4 } else { 0.1 };
                let quantity = study.quantity;
                assert!((order - formal).abs() < band, "{velocity}, {boundaries}: {quantity} of order {order:.3}");
            }
        }
    }

    /// Slabs of 0.2 m under `F = P + R f(x)`; orders measured by `converge` in 60 steps, landed: 1.50, 1.30, 1.50 and 2.
    #[test]
    fn a_force_without_a_slope_in_x_at_an_end_of_its_stage_limits_the_order_of_all() {
        let of = |force: &str| {
            let text = format!(
                "projectile.mass = 2\nimpact.velocity = 300\ntarget.thickness = 0.2\n[parameters]\nP = '100 kN'\n\
                 R = '100 kN'\nH = '0.2 m'\n[[stage]]\nforce = 'P + R*{force}'\n"
            );
            let problem = crate::physics::Scene::from_toml(&text, "law").unwrap().problem().unwrap();
            let order = |speed: f64, quantity| {
                let problem = Problem { impact_speed: speed, ..problem.clone() };
                let flight = Taylor::default().solve(&problem, crate::integrators::Detail::Events).unwrap();
                let path = Path::of(&problem, &flight);
                assert_eq!(formal_order(VelocityAt::Centred, Boundaries::StepEnd, &path, Quantity::Time), Some(1.0));
                formal_order(VelocityAt::Centred, Boundaries::Landed, &path, quantity).unwrap()
            };
            if force == "sqrt(max(0, 1 - x/H))" {
                assert_eq!(order(300.0, Quantity::Time), 2.0);
            }
            [order(300.0, Quantity::Velocity), order(100.0, Quantity::Depth)]
        };
        let is = |force: &str, [leaves, stops]: [f64; 2]| {
            let found = of(force);
            assert!((found[0] - leaves).abs() < 1e-3 && (found[1] - stops).abs() < 1e-3, "{force}: {found:?}");
        };
        is("sqrt(x/H)", [1.5, 1.5]);
        is("(x/H)^0.3", [1.3, 1.3]);
        is("sqrt(max(0, 1 - x/H))", [1.5, 2.0]);
        is("sqrt(max(0, 1 - 4*x/H))", [1.5, 1.5]);
        is("(1 + max(0, 0.37*H - x)/H)", [2.0, 2.0]);
        is("tanh(1e4*x/H)", [2.0, 2.0]);
        is("(x/H)^1.5", [2.0, 2.0]);
        is("x/H*H/H", [2.0, 2.0]);
    }

    /// Orders measured by `converge` in 60 steps, landed and interpolated: 0.95, 1.5 and 2.
    #[test]
    fn a_force_that_is_not_smooth_in_v_at_rest_limits_the_order_of_the_time_alone() {
        let of = |force: &str| {
            let used = if force.starts_with('P') { "P = '848 kN'\n" } else { "" };
            let text = format!(
                "projectile.mass = 2\nimpact.velocity = 300\n[parameters]\n{used}R = '500 kN'\nv1 = '50 m/s'\n\
                 [[stage]]\nforce = '{force}'\n"
            );
            let problem = crate::physics::Scene::from_toml(&text, "law").unwrap().problem().unwrap();
            let flight = Taylor::default().solve(&problem, crate::integrators::Detail::Events).unwrap();
            let path = Path::of(&problem, &flight);
            let order = |quantity| formal_order(VelocityAt::Centred, Boundaries::Landed, &path, quantity).unwrap();
            assert_eq!(order(Quantity::Depth), 2.0);
            assert_eq!(formal_order(VelocityAt::Centred, Boundaries::StepEnd, &path, Quantity::Time), Some(1.0));
            order(Quantity::Time)
        };
        assert_eq!(of("R*(V/v1)^0.2"), 1.0);
        assert!((of("P + R*(V/v1)^0.5") - 1.5).abs() < 1e-6);
        assert_eq!([of("P + R*(V/v1)^1.5"), of("P + R*V/v1"), of("P + R*(V/v1)^2")], [2.0; 3]);
    }
}
