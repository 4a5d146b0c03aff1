//! The library methods: `tsit45`, `bdf`, `esdirk34` and `tr-bdf2` of the crate `diffsol`, behind one adapter.
//!
//! Each stage is one smooth problem for the library: the law of the stage holds beyond both of its ends. It is solved
//! in the stage's own units (depth L, speed V0, time L/V0):
//!
//! ```text
//! du/dtau = -(p + s xi + r u + q u²),  dxi/dtau = u,  xi(0) = 0,  until xi = distance or u = 0
//! ```
//!
//! `xi` counts from the start of the stage. L is the first boundary in x, the exit depth among them, or the distance
//! through the stage where that is shorter. In these units the absolute tolerances are both `rtol`, for every scene: one problem and one solver
//! serve a whole study, and only the four coefficients change. Under a law of its own whose force falls far to rest the time there hangs
//! on small velocities: that of the velocity is 1e-12 times as much.
//!
//! # What the library cannot be trusted with
//!
//! Read in and measured on diffsol 0.18.0; each has its answer in this file and nowhere else:
//!
//! | fault | answer |
//! |---|---|
//! | two roots in a step: one is lost; `g0 g1 < 0` underflows; a root at the start never fires | no root function is given: every step ends with a look at (xi, u), and roots are located here |
//! | a step may cross the boundary and come back; then u = 0 fires and the crossing is lost | u = 0 is located first; when the depth there is past the boundary, the crossing before it is located |
//! | no largest step | none is needed for a law whose static force keeps its sign; an underdamped spring has `1/w` |
//! | explicit steps accept NaN, and any step may hide an excursion to u < 0 that ends behind its start | the step is tried again, ten times shorter |
//! | no largest number of steps, `solve` may never return | steps are counted here; `solve` is not used |
//! | the first step is chosen with no thought of the law, `h0` is ignored | `h` is written into the state |
//! | `dy` of the last stage survives a change of the law | it is computed anew with the new law; the law is set before a solver is made |
//! | Newton failures are counted over a solver's life and fail it at 50, a Jacobian outlives the law | an implicit solver lives for one stage |

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::rc::Rc;

use diffsol::{
    DiffsolError, NalgebraContext, NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations,
    OdeEquationsImplicit, OdeSolverMethod, OdeSolverProblem, OdeSolverState, Tableau, Vector,
};
use self_cell::self_cell;

use super::adaptive::{Choice, EXPLICIT, IMPLICIT};
use super::flight::{self, Bounded, Course, SLOW, StageEnd, StageSolver, VANISHES, VANISHING, rest_by_power};
use super::outcome::{Cost, Detail, IntegrationError, Integrator, Solved};
use crate::physics::condition::Sight;
use crate::physics::{Law, Problem, Stage, State};

type Matrix = NalgebraMat<f64>;
type Pair = NalgebraVec<f64>;
type Factors = NalgebraLU<f64>;

/// Default largest number of steps of a flight.
pub const MAX_STEPS: u64 = 1_000_000;

/// A method of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Scheme {
    /// Tsitouras 5(4), explicit; dense output of order 4. First choice for every stage that only resists.
    Tsit45,
    /// Backward differentiation (NDF) of order 1 to 5, implicit. First choice for a stiff stage.
    Bdf,
    /// Singly diagonally implicit Runge-Kutta method of order 3, L-stable; dense output is the cubic of Hermite.
    Esdirk34,
    /// Trapezoidal rule and second-order backward difference in one step, order 2, L-stable.
    TrBdf2,
}

impl Scheme {
    /// Every scheme.
    pub const ALL: [Self; 4] = [Self::Tsit45, Self::Bdf, Self::Esdirk34, Self::TrBdf2];

    /// Name of the method.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Order of the solution that is continued; `None` for a method of variable order.
    pub fn order(self) -> Option<u32> {
        match self {
            Self::Tsit45 => Some(5),
            Self::Bdf => None,
            Self::Esdirk34 => Some(3),
            Self::TrBdf2 => Some(2),
        }
    }

    /// Whether each step solves an equation, with a Jacobian.
    pub fn is_implicit(self) -> bool {
        self != Self::Tsit45
    }

    /// Error of W(exit)/V0² that the bound allows for each stage, in units of the largest V²/V0² in the stage.
    ///
    /// An error of energy never grows with depth, since resistance never falls with speed (`r, q >= 0`); so the bound
    /// grows with the number of steps, which a method of order k needs in proportion to `rtol^(-1/(k+1))`. In front
    /// stands a factor that is measured, on 1,200 random scenes for each of the tolerances 1e-3, 1e-6, 1e-8, 1e-10 and
    /// 1e-12; the worst of them came to 0.31 of the bound. Of 35,000 more at 1e-10 one came to 0.61 with `tsit45`.
    fn margin_error(self, rtol: f64) -> f64 {
        match self {
            Self::Tsit45 => 12.0 * rtol,
            Self::Bdf => 6.0 * rtol.powf(5.0 / 6.0),
            Self::Esdirk34 => 4.0 * self.library_rtol(rtol).powf(3.0 / 4.0),
            Self::TrBdf2 => 3.0 * self.library_rtol(rtol).powf(2.0 / 3.0),
        }
    }

    /// The tolerance asked of the library.
    ///
    /// Tighter for the implicit Runge-Kutta methods, whose local errors add up over thousands of steps, so that at rtol
    /// 1e-12 they stay within 1e-9 in depth and 1e-8 in time. What decides is the time of rest of a viscous stage, where
    /// the velocity dies out slowly: 2e-8 with `esdirk34` at rtol itself and 4e-9 at a tenth, for 1.8 times the steps;
    /// 1e-7 with `tr-bdf2` at rtol itself and 1e-8 at three hundredths, for 3.2 times the steps.
    fn library_rtol(self, rtol: f64) -> f64 {
        match self {
            Self::Tsit45 | Self::Bdf => rtol,
            Self::Esdirk34 => 0.1 * rtol,
            // Below 1e-15 the Newton iterations meet round-off.
            Self::TrBdf2 => (0.03 * rtol).max(1e-15),
        }
    }

    /// The tightest tolerance: below it the Newton iterations of `bdf` no longer converge.
    fn rtol_min(self) -> f64 {
        if self.is_implicit() { 1e-14 } else { 1e-15 }
    }

    /// Share of the fastest time in a stage that the first step takes: the local error of a step of that length is
    /// about the tolerance.
    fn first_step_share(self, rtol: f64) -> f64 {
        // A method of variable order starts with the first.
        0.5 * self.library_rtol(rtol).powf(1.0 / (f64::from(self.order().unwrap_or(1)) + 1.0))
    }
}

/// A library method at a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffsol {
    /// The method; `None` chooses one for each stage ([`super::adaptive`]).
    pub scheme: Option<Scheme>,
    /// Relative tolerance of each step, 1e-15 (`tsit45`) or 1e-14 to 0.1; the absolute ones are `rtol` times the first boundary in x
    /// (else the exit depth) and times V0.
    pub rtol: f64,
    /// Largest number of steps of one flight.
    pub max_steps: u64,
}

impl Diffsol {
    /// `scheme` at relative tolerance `rtol`, with [`MAX_STEPS`].
    pub fn new(scheme: Scheme, rtol: f64) -> Self {
        Self { scheme: Some(scheme), rtol, max_steps: MAX_STEPS }
    }

    /// The method `adaptive` at relative tolerance `rtol`, with [`MAX_STEPS`].
    pub fn adaptive(rtol: f64) -> Self {
        Self { scheme: None, rtol, max_steps: MAX_STEPS }
    }

    fn solver(&self) -> Solved<Reusing> {
        let strictest = self.scheme.unwrap_or(IMPLICIT);
        if !(strictest.rtol_min()..=0.1).contains(&self.rtol) {
            let allowed = if strictest.is_implicit() { "1e-14 to 0.1" } else { "1e-15 to 0.1" };
            return Err(IntegrationError::bad_option("rtol", &format!("{:e}", self.rtol), allowed));
        }
        Ok(Reusing { of: *self, solvers: RefCell::default() })
    }

    fn budget_spent(&self, last: State) -> IntegrationError {
        let remedy = if self.scheme == Some(Scheme::Tsit45) {
            "take --method adaptive, or a looser --rtol"
        } else {
            "take a looser --rtol, or --method taylor"
        };
        IntegrationError::StepBudgetSpent { max_steps: self.max_steps, remedy, last }
    }
}

impl Integrator for Diffsol {
    fn name(&self) -> &'static str {
        self.scheme.map_or("adaptive", Scheme::name)
    }

    fn order(&self) -> Option<u32> {
        self.scheme.and_then(Scheme::order)
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        self.solver()?.solve(problem, detail)
    }

    fn reusing(&self) -> Option<Box<dyn Integrator>> {
        self.solver().ok().map(|solver| Box::new(solver) as Box<dyn Integrator>)
    }
}

/// A method with its library solvers, which are reused from stage to stage and from flight to flight.
///
/// A flight does not depend on the flights before it, save that its cost lacks the evaluations that making a solver
/// takes.
struct Reusing {
    of: Diffsol,
    /// For each scheme that was asked, and for stages whose force falls to rest ([`Reduced::falls`]) or does not.
    solvers: RefCell<HashMap<(Scheme, bool), Solver>>,
}

impl Integrator for Reusing {
    fn name(&self) -> &'static str {
        self.of.name()
    }

    fn order(&self) -> Option<u32> {
        self.of.order()
    }

    fn solve(&self, problem: &Problem, detail: Detail) -> Solved {
        let mut method = self;
        flight::solve(problem, detail, &mut method)
    }
}

impl StageSolver<f64> for &Reusing {
    fn solve_stage(&mut self, course: &mut Course<'_>) -> Solved<StageEnd> {
        let stage = Reduced::of(course)?;
        let chosen = || if Choice::note(course).is_implicit() { IMPLICIT } else { EXPLICIT };
        let scheme = self.of.scheme.unwrap_or_else(chosen);
        let mut solvers = self.solvers.borrow_mut();
        let solver = match solvers.entry((scheme, stage.falls)) {
            Entry::Occupied(solver) => solver.into_mut(),
            Entry::Vacant(place) => place.insert(Solver::of(scheme, self.of.rtol, stage.falls)?),
        };
        solver.with_dependent_mut(|_, solve| solve(&stage, &self.of, course))
    }

    fn margin(&mut self, course: &mut Course<'_>) -> Solved<Bounded> {
        // A depth has 53 bits, and what is left of the target behind a stop may be no longer than its rounding.
        let (mass, impact_speed) = (course.mass, course.problem.impact_speed);
        let force = course.problem.force(course.stage, course.state.depth, 0.0).abs();
        let rounding = f64::EPSILON * (2.0 * force / mass) * course.state.depth / impact_speed / impact_speed;
        let bound = course.error_bound + if course.state.velocity > 0.0 { 0.0 } else { rounding };
        Ok(Bounded { bound, ..course.margin() })
    }
}

/// A stage of mass one in its own units: its force is `-du/dtau`, its end the distance to the limit.
impl Stage {
    /// The longest step that cannot hide two zeros of u: `1/w` for an underdamped spring, else none is needed.
    ///
    /// Between two zeros of u lies half a period, `pi/w` at least. Without a spring, or with an overdamped one, the
    /// static force at rest has one sign and u has one zero at most; so has the sum of two exponentials where s < 0.
    fn longest_step(&self) -> f64 {
        let Self { stiffness: s, viscosity: r, .. } = *self;
        if s > 0.0 && r * r < 4.0 * s { 1.0 / s.sqrt() } else { f64::INFINITY }
    }

    /// Whether nothing opposes a standstill at the place where the static force is zero, so that speed may run out
    /// with no force to end it: a static force of zero at the start of the stage, or a drive that fades and is overdamped.
    fn may_hang(&self) -> bool {
        let Self { static_force: p, stiffness: s, viscosity: r, .. } = *self;
        p == 0.0 || (p < 0.0 && s > 0.0 && r * r >= 4.0 * s)
    }

    /// How far the projectile can still creep [L] where the static force does not stop it.
    fn reach(&self, at: Node) -> f64 {
        let Self { static_force: p, stiffness: s, viscosity: r, .. } = *self;
        if p < 0.0 {
            if s > 0.0 { (-p / s - at.depth).max(0.0) } else { f64::INFINITY }
        } else if r > 0.0 {
            at.velocity / r
        } else {
            f64::INFINITY
        }
    }

    /// Decides what u = 0 means, given that the solver may be off by `noise`, relative.
    ///
    /// Where the static force resists, it is a rest. Elsewhere the speed was lost in the tolerance. If the boundary is
    /// within reach, it counts as reached with u = 0, so that the margin is zero within its error bound (`Undecided`).
    /// If not, the place is approached for ever.
    fn meaning_of_standstill(&self, at: Node, noise: f64) -> StageEnd {
        let Self { static_force: p, stiffness: s, end: distance, .. } = *self;
        let resists = p > 0.0 || (p == 0.0 && s > 0.0);
        let least_brake = if self.may_hang() { noise * (p.abs() + s.abs() * at.depth.abs()) } else { 0.0 };
        if resists || p + s * at.depth > least_brake {
            return StageEnd::Rest(Node { depth: at.depth.max(0.0), velocity: 0.0, ..at });
        }
        let in_reach = distance - at.depth <= self.reach(at) + noise * (1.0 + at.depth.abs());
        if in_reach && distance.is_finite() {
            return StageEnd::Limit(Node { depth: distance, velocity: 0.0, ..at });
        }
        StageEnd::Approach(at, "it only approaches the place where nothing moves it on")
    }

    /// The shortest time in which something happens at speed `u` [L/V0].
    fn shortest_time(&self, u: f64) -> f64 {
        let rates = [
            u / self.end.max(f64::MIN_POSITIVE),
            self.force(0.0, u).abs() / u.max(f64::MIN_POSITIVE),
            self.static_force.abs(),
            self.stiffness.abs().sqrt(),
            self.viscosity + 2.0 * self.drag * u,
        ];
        let fastest = rates.into_iter().fold(0.0, f64::max);
        if fastest > 0.0 { (1.0 / fastest).max(f64::MIN_POSITIVE) } else { 1.0 }
    }
}

/// The length L (m) of a problem: the first boundary in x, the exit depth among them, else the shortest length that the
/// first stage's law has.
fn length_of(problem: &Problem) -> f64 {
    let speed = problem.impact_speed;
    let boundary = problem
        .stages
        .iter()
        .map(|stage| stage.end)
        .chain([problem.exit_depth])
        .filter(|&depth| depth > 0.0 && depth.is_finite())
        .reduce(f64::min);
    let law = problem.linear(0, State::at_impact(problem));
    let (m, w) = (problem.mass, speed * speed);
    let own = [
        m * w / (2.0 * law.static_force.abs()),
        speed * (m / law.stiffness.abs()).sqrt(),
        m * speed / law.viscosity,
        m / law.drag,
    ];
    let own = own.into_iter().filter(|length| length.is_finite() && *length > 0.0).fold(f64::INFINITY, f64::min);
    boundary.unwrap_or(if own.is_finite() { own } else { 1.0 })
}

/// One stage in its own units.
struct Reduced {
    /// Its coefficients; where it has a law of its own, those of the law made linear at the start.
    law: Stage,
    own: Option<Rc<OwnLaw>>,
    /// Unit of depth L (m).
    length: f64,
    /// Unit of speed V0 (m/s).
    unit_speed: f64,
    /// State at the start; moving.
    start: State,
    /// Speed at the start [V0].
    speed: f64,
    /// Whether its force falls so far to rest that the time to rest hangs on velocities below the tolerance.
    falls: bool,
}

impl Reduced {
    fn of(course: &Course<'_>) -> Solved<Self> {
        let (problem, start, mass) = (course.problem, course.state, course.mass);
        let limit = problem.limit_of(course.stage);
        // What the tolerance leaves open in x must be little beside the stage: a thin rest of a slab is its own unit.
        let (length, speed) = (length_of(problem).min(limit - start.depth), problem.impact_speed);
        let stage = &problem.linear(course.stage, start);
        let law = Stage {
            static_force: (stage.static_force + stage.stiffness * start.depth) / mass * length / speed / speed,
            stiffness: stage.stiffness / mass * (length / speed) * (length / speed),
            viscosity: stage.viscosity / mass * (length / speed),
            drag: stage.drag / mass * length,
            end: (limit - start.depth) / length,
        };
        let numbers = [law.static_force, law.stiffness, law.viscosity, law.drag];
        if !numbers.iter().all(|number| number.is_finite()) || law.end.is_nan() {
            return Err(IntegrationError::NotFinite { what: "the force over the mass", last: start });
        }
        course.limit()?;
        let own = course.law().map(|law| {
            Rc::new(OwnLaw {
                law: law.clone(),
                start: start.depth,
                length,
                speed,
                acceleration: length / mass / speed / speed,
                side: law.end().map_or(1.0, |end| end.side(start)),
            })
        });
        let falls = own.as_ref().is_some_and(|own| own.falls_to_rest(start.velocity));
        Ok(Self { law, own, length, unit_speed: speed, start, speed: start.velocity / speed, falls })
    }

    /// The state at `node`.
    fn state(&self, node: Node) -> State {
        State {
            time: self.start.time + node.time * (self.length / self.unit_speed),
            depth: self.start.depth + node.depth * self.length,
            velocity: node.velocity * self.unit_speed,
        }
    }

    /// Whether a law of its own holds a projectile at `at` that is as good as at rest: no step may pass where a force has no bound
    /// at rest.
    fn is_held(&self, at: Node) -> bool {
        self.own.as_ref().is_some_and(|own| own.force(&[at.depth, at.velocity]) > 0.0)
    }

    /// What `end`, found in these units with times that count from `epoch` and `noise` in its speed, means.
    fn end_of(&self, course: &Course<'_>, end: StageEnd, epoch: f64, noise: f64) -> Solved<StageEnd> {
        let end = match (end, &self.own) {
            (StageEnd::Rest(place), Some(own)) if !own.stops(place) => StageEnd::Approach(place, VANISHES),
            (StageEnd::Rest(place), None) => self.law.meaning_of_standstill(place, noise),
            (found, _) => found,
        };
        let state = |at: Node| self.state(Node { time: epoch + at.time, ..at });
        Ok(match end {
            StageEnd::Limit(at) => StageEnd::Limit(State { depth: course.limit()?, ..state(at) }),
            StageEnd::Condition(at) => {
                let at = state(at);
                StageEnd::Condition(course.law().and_then(Law::end).map_or(at, |end| end.at_end(at)))
            }
            StageEnd::Rest(at) => StageEnd::Rest(state(at)),
            StageEnd::Approach(at, why) => StageEnd::Approach(state(at), why),
        })
    }
}

/// A law of its own in the units of a stage.
struct OwnLaw {
    law: Law,
    /// Depth (m) at the start of the stage.
    start: f64,
    /// Unit of depth L (m).
    length: f64,
    /// Unit of speed V0 (m/s).
    speed: f64,
    /// `L/(M V0²)`, which makes a force a deceleration in these units.
    acceleration: f64,
    /// The sign of the condition of the stage on the way to its zero.
    side: f64,
}

impl OwnLaw {
    /// Depth (m) and velocity (m/s); the velocity not below zero, where a power of it has no value.
    fn place(&self, y: &[f64]) -> (f64, f64) {
        (self.start + y[0] * self.length, (y[1] * self.speed).max(0.0))
    }

    /// Whether a standstill at `place` is a rest.
    fn stops(&self, place: Node) -> bool {
        let (depth, _) = self.place(&[place.depth, 0.0]);
        self.law.stops(depth, self.speed)
    }

    /// Whether its force at rest is little beside that at `velocity` (m/s), and ends the motion.
    fn falls_to_rest(&self, velocity: f64) -> bool {
        let inside = self.start + 0.5 * self.length;
        let [at_rest, at_start] = [0.0, velocity].map(|velocity| self.law.force_value(inside, velocity));
        (0.0..FALLEN * at_start).contains(&at_rest) && self.law.stops(inside, velocity)
    }

    /// The end of a flight that is as good as over `at` a node, in front of the limit at `end`: rest where the force vanishes as a power
    /// of the velocity, or an approach.
    fn end_of_slow(&self, at: Node, end: f64) -> Option<StageEnd> {
        let (depth, velocity) = self.place(&[at.depth, at.velocity]);
        if at.velocity <= VANISHING && self.law.force_value(depth, 0.0) == 0.0 && self.stops(at) {
            let rest = rest_by_power(at, self.force(&[at.depth, at.velocity]), self.law.power(depth, velocity));
            return (rest.depth < end).then_some(StageEnd::Rest(rest));
        }
        (at.velocity < SLOW && self.is_approach(at, end)).then_some(StageEnd::Approach(at, VANISHES))
    }

    /// Adds to `seen` what the step from `before` to `after` shows, on the library's interpolant `at`.
    fn note(
        &self,
        seen: &mut Seen,
        [before, after]: [Node; 2],
        mut at: impl FnMut(f64) -> Result<(f64, f64), DiffsolError>,
    ) -> Result<(), DiffsolError> {
        let force = |node: Node| self.force(&[node.depth, node.velocity]);
        let falls = [before, after].map(|node| -self.slopes(&[node.depth, node.velocity]).1);
        // On a piece of a table of velocity F_V is one number, and errors fall by it too.
        let fall = if self.law.line().is_some() { falls[0] } else { falls[0].max(falls[1]).max(0.0) };
        seen.growth += (after.time - before.time) * fall;
        if !(force(before) > 0.0 && force(after) < 0.0) {
            return Ok(());
        }
        let (mut low, mut high) = (before, after);
        for _ in 0..HALVINGS {
            let time = 0.5 * (low.time + high.time);
            let (depth, velocity) = at(time)?;
            let middle = Node { time, depth, velocity };
            if force(middle) > 0.0 { low = middle } else { high = middle }
        }
        seen.least = seen.least.min(high.velocity.max(0.0));
        Ok(())
    }

    /// Length of a step that ends at the kink which the step from `before` to `after` has passed; `None` where it has
    /// passed none, or one that lies at an end of it.
    fn to_kink(
        &self,
        before: Node,
        after: Node,
        mut at: impl FnMut(f64) -> Result<[f64; 2], DiffsolError>,
    ) -> Result<Option<f64>, DiffsolError> {
        let sides = |y: [f64; 2]| {
            let (depth, velocity) = self.place(&y);
            self.law.sides(depth, velocity)
        };
        let first = sides([before.depth, before.velocity]);
        if first.is_empty() || first == sides([after.depth, after.velocity]) {
            return Ok(None);
        }
        let length = first_time(before.time, after.time, |time| Ok(sides(at(time)?) != first))? - before.time;
        let share = length / (after.time - before.time);
        Ok((AT_AN_END..1.0 - AT_AN_END).contains(&share).then_some(length))
    }

    /// Length of a shorter step, where this one passed a kink or may hide a part of the force.
    ///
    /// As [`Self::to_kink`], but for `kink`, the time of the one that a step was shortened to: a step that starts there
    /// passes it. Times of nodes count from `epoch`.
    fn to_new_kink(
        &self,
        kink: &mut Option<f64>,
        epoch: f64,
        before: Node,
        after: Node,
        mut at: impl FnMut(f64) -> Result<[f64; 2], DiffsolError>,
    ) -> Result<Option<f64>, DiffsolError> {
        // Behind rest the path turns round: its ends would not show how deep it goes.
        let after = if after.velocity < 0.0 { Self::turn(before, after, &mut at)? } else { after };
        let start = epoch + before.time;
        let is_at_kink = kink.is_some_and(|kink| (start - kink).abs() <= 1e-3 * (after.time - before.time));
        if !is_at_kink && let Some(length) = self.to_kink(before, after, &mut at)? {
            *kink = Some(start + length);
            return Ok(Some(length));
        }
        let step = after.time - before.time;
        let is_narrow = step <= NARROWEST * start;
        if !(is_narrow || self.hides_nothing(before, after, is_at_kink)) {
            return Ok(Some(SHORTENING * step));
        }
        if let Some(end) = self.law.end().filter(|_| !is_narrow) {
            let place = |share| at(before.time + share * step).map(|y| self.place(&y));
            if let Sight::Hidden(from, to) = end.look(self.side, place)? {
                return Ok(Some(if from > 0.0 { from } else { to } * step));
            }
        }
        kink.take_if(|_| is_at_kink);
        Ok(None)
    }

    /// Where the step from `before` to `after` turns round.
    fn turn(
        before: Node,
        after: Node,
        mut at: impl FnMut(f64) -> Result<[f64; 2], DiffsolError>,
    ) -> Result<Node, DiffsolError> {
        let time = first_time(before.time, after.time, |time| at(time).map(|[_, velocity]| velocity <= 0.0))?;
        let [depth, _] = at(time)?;
        Ok(Node { time, depth, velocity: 0.0 })
    }

    /// Whether the step from `before` to `after` shows its force ([`Law::is_shown_by`]).
    fn hides_nothing(&self, before: Node, after: Node, is_at_kink: bool) -> bool {
        let ends = [before, after].map(|node| self.place(&[node.depth, node.velocity]));
        let mass = self.length / self.acceleration / self.speed / self.speed;
        let at_kink = [if is_at_kink { AFTER_KINK } else { AT_AN_END }, AT_AN_END];
        self.law.is_shown_by(ends, at_kink, mass * self.speed * self.speed)
    }

    /// Whether it only goes on slowing down from `at` (in the units of the stage) to the limit at `end`.
    fn is_approach(&self, at: Node, end: f64) -> bool {
        let (depth, velocity) = self.place(&[at.depth, at.velocity]);
        let mass = self.length / self.acceleration / self.speed / self.speed;
        let (place, distance) = (State { time: at.time, depth, velocity }, (end - at.depth) * self.length);
        let depths = (depth, depth + self.law.reach(mass, place).min(distance));
        let may_end = self.law.end().is_some_and(|end| end.may_vanish(depths, (0.0, velocity)));
        !may_end && self.law.is_approach(mass, place, distance)
    }

    /// The condition at a node, above zero on the way to its end, and its slope over time.
    fn condition(&self, at: Node) -> (f64, f64) {
        let Some(end) = self.law.end() else { return (f64::INFINITY, 0.0) };
        let (depth, velocity) = self.place(&[at.depth, at.velocity]);
        let (_, by_depth, by_velocity) = end.gradient(depth, velocity);
        let slope =
            by_depth * self.length * at.velocity - by_velocity * self.speed * self.force(&[at.depth, at.velocity]);
        (self.side * end.value(depth, velocity), self.side * slope)
    }

    /// `end` of a step between two nodes, or the condition that is met in front of it, for an error of `lost` in u².
    fn or_condition(
        &self,
        course: &mut Course<'_>,
        lost: f64,
        [before, after]: [Node; 2],
        end: Option<StageEnd>,
        mut interpolant: impl FnMut(f64) -> Result<(f64, f64), DiffsolError>,
    ) -> Result<Option<StageEnd>, DiffsolError> {
        let last = end.map_or(after, StageEnd::state);
        let node = |time| interpolant(time).map(|(xi, u)| Node { time, depth: xi, velocity: u });
        let (zero, is_open) = self.first_zero(before, last, lost, node)?;
        course.is_in_doubt |= is_open;
        Ok(zero.map(StageEnd::Condition).or(end))
    }

    /// Where the condition is met first between two nodes, on the library's interpolant `at`; and whether an error of
    /// `lost` in u² leaves that open.
    fn first_zero(
        &self,
        before: Node,
        after: Node,
        lost: f64,
        mut at: impl FnMut(f64) -> Result<Node, DiffsolError>,
    ) -> Result<(Option<Node>, bool), DiffsolError> {
        let Some(end) = self.law.end() else { return Ok((None, false)) };
        let ends = [before, after].map(|node| self.place(&[node.depth, node.velocity]));
        let (slow, fast) = (ends[0].1.min(ends[1].1), ends[0].1.max(ends[1].1));
        let spread = 0.5 * (fast - slow) + lost.sqrt() * self.speed;
        if !end.may_vanish((ends[0].0, ends[1].0), ((slow - spread).max(0.0), fast + spread)) {
            return Ok((None, false));
        }
        let value = |node: Node| self.condition(node).0;
        let place = |part: usize| before.time + (after.time - before.time) * part as f64 / LOOKS as f64;
        let mut seen = [before; LOOKS + 1];
        for (part, node) in seen.iter_mut().enumerate().skip(1) {
            *node = if part == LOOKS { after } else { at(place(part))? };
        }
        let mut at_share = |share: f64| at(before.time + (after.time - before.time) * share);
        let sight = end.look(self.side, |share| {
            let node = if share < 1.0 { at_share(share)? } else { after };
            Ok::<_, DiffsolError>(self.place(&[node.depth, node.velocity]))
        })?;
        let mut crossing = match sight {
            Sight::Crossed(from, to) => Some((at_share(from)?, if to < 1.0 { at_share(to)? } else { after })),
            _ => (1..=LOOKS).find(|part| value(seen[*part]) <= 0.0).map(|part| (seen[part - 1], seen[part])),
        };
        let mut nearest = after;
        if crossing.is_none() {
            // Where it is nearest to zero, it may touch it.
            let least = (0..=LOOKS).min_by(|a, b| value(seen[*a]).total_cmp(&value(seen[*b]))).unwrap_or(LOOKS);
            let (mut low, mut high) = (seen[least.saturating_sub(1)].time, seen[(least + 1).min(LOOKS)].time);
            for _ in 0..HALVINGS {
                let [one, other] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
                let [left, right] = [at(one)?, at(other)?];
                if value(left) <= value(right) { high = other } else { low = one }
            }
            nearest = at(0.5 * (low + high))?;
            if value(after) < value(nearest) {
                nearest = after;
            }
            if value(nearest) <= 0.0 {
                crossing = Some((before, nearest));
            }
        }
        let error = |node: Node| {
            let (depth, velocity) = self.place(&[node.depth, node.velocity]);
            let error = if node.velocity > lost.sqrt() { 0.5 * lost / node.velocity } else { lost.sqrt() };
            let (_, by_depth, by_velocity) = end.gradient(depth, velocity);
            error * (by_velocity.abs() * self.speed + by_depth.abs() * self.length) + end.noise(depth, velocity)
        };
        let Some((from, to)) = crossing else { return Ok((None, value(nearest) <= error(nearest))) };
        let size = value(from);
        let found = bracketed_root(from, to, 1e-3 * size, |node| self.condition(node), at)?;
        // The parabola through the zero goes so far beyond it.
        let rate = self.condition(found).1;
        let curvature = (self.condition(to).1 - self.condition(from).1) / (to.time - from.time);
        let beyond = if curvature > 0.0 { 0.5 * rate * rate / curvature } else { f64::INFINITY };
        Ok((Some(found), beyond <= error(found)))
    }

    /// The force; below rest, where a step may look for it, along its tangent at rest. A kink there would spoil the interpolant
    /// on which rest is located.
    fn force(&self, y: &[f64]) -> f64 {
        let (depth, velocity) = self.place(y);
        let force = self.law.force(depth, velocity) * self.acceleration;
        if y[1] < 0.0 { force + self.slopes(y).1 * y[1] } else { force }
    }

    /// Derivatives of the force by depth and velocity; zero where it has none, as a power below one at rest.
    fn slopes(&self, y: &[f64]) -> (f64, f64) {
        let (depth, velocity) = self.place(y);
        let (by_depth, by_velocity) = self.law.slopes(depth, velocity);
        let scaled = |slope: f64, unit: f64| if slope.is_finite() { slope * self.acceleration * unit } else { 0.0 };
        (scaled(by_depth, self.length), scaled(by_velocity, self.speed))
    }
}

/// The first time at which `is_past`, between one at which it is not and one at which it is.
fn first_time(
    mut before: f64,
    mut past: f64,
    mut is_past: impl FnMut(f64) -> Result<bool, DiffsolError>,
) -> Result<f64, DiffsolError> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (before + past);
        *if is_past(middle)? { &mut past } else { &mut before } = middle;
    }
    Ok(past)
}

/// What the steps of a stage have shown.
struct Seen {
    /// Largest u².
    energy_max: f64,
    /// Time of the kink that a step was shortened to.
    kink: Option<f64>,
    /// Of a law of its own: least velocity where the force changes from slowing to driving [V0].
    least: f64,
    /// Integral of `-F_V` over the time where it is positive, of a piece of a table over all: the logarithm by which an error of
    /// `W/V0²` may have grown, or has fallen.
    growth: f64,
}

impl Seen {
    fn from(stage: &Reduced) -> Self {
        Self { energy_max: stage.speed * stage.speed, kink: None, least: f64::INFINITY, growth: 0.0 }
    }

    /// Widens the error bound of `W/V0²` by what `steps` of the scheme at a tolerance leave; by a law of its own also by what
    /// the library allows each step, and by the growth of both.
    fn widen_bound(&self, course: &mut Course<'_>, stage: &Reduced, (scheme, rtol): (Scheme, f64), steps: f64) {
        let of_scheme = (scheme.margin_error(rtol) + 4.0 * f64::EPSILON * steps) * self.energy_max;
        if stage.own.is_none() {
            course.error_bound += of_scheme;
        } else {
            let added = of_scheme + ERROR_OF_STEP * scheme.library_rtol(rtol) * steps * self.energy_max;
            // What is added late falls no more.
            course.error_bound = course.error_bound * self.growth.exp() + added * self.growth.max(0.0).exp();
            course.pass_least(self.least * stage.unit_speed);
        }
    }
}

/// The law that the library's closures read, and what they count.
struct Force {
    /// Coefficients; `None` where the stage has a law of its own.
    law: Cell<Option<Stage>>,
    own: RefCell<Option<Rc<OwnLaw>>>,
    start: Cell<(f64, f64)>,
    evaluations: Cell<u64>,
}

impl Force {
    #[inline]
    fn rate(&self, y: &[f64], dy: &mut [f64]) {
        self.evaluations.set(self.evaluations.get() + 1);
        dy[0] = y[1];
        dy[1] = -self.force(y);
    }

    #[inline]
    fn force(&self, y: &[f64]) -> f64 {
        self.law.get().map_or_else(|| self.own_force(y), |law| law.force(y[0], y[1]))
    }

    #[cold]
    fn own_force(&self, y: &[f64]) -> f64 {
        self.own.borrow().as_ref().map_or(f64::NAN, |own| own.force(y))
    }

    #[inline]
    fn jacobian_product(&self, y: &[f64], v: &[f64], jv: &mut [f64]) {
        jv[0] = v[1];
        let (by_depth, by_velocity) = self
            .law
            .get()
            .map_or_else(|| self.own_slopes(y), |law| (law.stiffness, law.viscosity + 2.0 * law.drag * y[1]));
        jv[1] = -(by_depth * v[0] + by_velocity * v[1]);
    }

    #[cold]
    fn own_slopes(&self, y: &[f64]) -> (f64, f64) {
        self.own.borrow().as_ref().map_or((f64::NAN, f64::NAN), |own| own.slopes(y))
    }

    fn start(&self, y: &mut [f64]) {
        (y[0], y[1]) = self.start.get();
    }
}

/// What solves a stage, in its own units and as a method asks for it.
type SolveStage<'p> = Box<dyn FnMut(&Reduced, &Diffsol, &mut Course<'_>) -> Solved<StageEnd> + 'p>;

/// The library's problem, which its solvers borrow.
trait LibraryProblem {
    fn stage_solver(&self) -> SolveStage<'_>;
}

self_cell! {
    /// The library's problem together with its solver.
    struct Solver {
        owner: Box<dyn LibraryProblem>,
        #[not_covariant]
        dependent: SolveStage,
    }
}

impl Solver {
    /// A solver by `scheme`, for tolerance `rtol`, of stages whose force `falls` to rest or does not.
    fn of(scheme: Scheme, rtol: f64, falls: bool) -> Solved<Self> {
        let force = Rc::new(Force {
            law: Cell::new(None),
            own: RefCell::default(),
            start: Cell::default(),
            evaluations: Cell::default(),
        });
        let [of_rate, of_jacobian, of_start] = [&force, &force, &force].map(Rc::clone);
        let tolerance = scheme.library_rtol(rtol);
        // Velocity [V0] down to which errors of the velocity are relative to itself.
        let floor = if falls { VANISHING } else { 1.0 };
        let mut problem = OdeBuilder::<Matrix>::new()
            .rtol(tolerance)
            .atol([tolerance, floor * tolerance])
            .rhs_implicit(
                move |y, _p, _t, dy| of_rate.rate(y, dy),
                move |y, _p, _t, v, jv| of_jacobian.jacobian_product(y, v, jv),
            )
            .init(move |_p, _t, y| of_start.start(y), 2)
            .build()
            .map_err(|cause| IntegrationError::SolverFailed {
                method: scheme.name(),
                cause: cause.to_string(),
                last: State { time: 0.0, depth: 0.0, velocity: 0.0 },
            })?;
        problem.ode_options.min_timestep = STEP_MIN;
        // A failing step ends at `min_timestep`; a stage of many steps may meet more than the default of 50.
        problem.ode_options.max_nonlinear_solver_failures = usize::MAX;
        Ok(Self::new(Box::new(OfScheme { scheme, rtol, floor, force, problem }), |owner| owner.stage_solver()))
    }
}

struct OfScheme<Eqn: OdeEquations> {
    scheme: Scheme,
    rtol: f64,
    floor: f64,
    force: Rc<Force>,
    problem: OdeSolverProblem<Eqn>,
}

impl<Eqn> LibraryProblem for OfScheme<Eqn>
where
    Eqn: OdeEquationsImplicit<M = Matrix, V = Pair, T = f64, C = NalgebraContext>,
{
    fn stage_solver(&self) -> SolveStage<'_> {
        let problem = &self.problem;
        match self.scheme {
            Scheme::Tsit45 => {
                let tableau = Tableau::<f64>::tsit45();
                self.solving(move |h| problem.tsit45_solver(of_step(problem.rk_state(&tableau)?, h)))
            }
            Scheme::Bdf => {
                self.solving(move |h| problem.bdf_solver::<Factors>(of_step(problem.bdf_state::<Factors>()?, h)))
            }
            Scheme::Esdirk34 => {
                let tableau = Tableau::<f64>::esdirk34();
                self.solving(move |h| problem.esdirk34_solver::<Factors>(of_step(problem.rk_state(&tableau)?, h)))
            }
            Scheme::TrBdf2 => {
                let tableau = Tableau::<f64>::tr_bdf2();
                self.solving(move |h| problem.tr_bdf2_solver::<Factors>(of_step(problem.rk_state(&tableau)?, h)))
            }
        }
    }
}

/// `state` with a first step of length `h`.
fn of_step<State: OdeSolverState<Pair>>(mut state: State, h: f64) -> State {
    *state.as_mut().h = h;
    state
}

impl<Eqn: OdeEquations<V = Pair, T = f64>> OfScheme<Eqn> {
    /// Solves stages with the solvers that `make` makes.
    fn solving<'p, S: OdeSolverMethod<'p, Eqn> + 'p>(
        &'p self,
        make: impl Fn(f64) -> Result<S, DiffsolError> + 'p,
    ) -> SolveStage<'p> {
        let scratch = Pair::zeros(2, NalgebraContext::default());
        let mut stages = SolverOf { of: self, make, reused: None, scratch };
        Box::new(move |stage, method, course| stages.solve(stage, method, course))
    }
}

/// Shortest step [L/V0]. Each stage starts at time zero, so no time swallows it.
const STEP_MIN: f64 = 1e-30;

/// Force at rest over that at the start below which errors of the velocity are kept relative to itself.
const FALLEN: f64 = 0.01;

/// Halvings of a step with a kink or a least velocity inside.
const HALVINGS: u32 = 40;

/// Error of a step by a law of its own, in the library's tolerance: what it tests leaves out kinks, and derivatives that are
/// large at rest.
const ERROR_OF_STEP: f64 = 4.0;

/// Parts of a step at whose ends a condition is asked.
const LOOKS: usize = 8;

/// By what a step is shortened that may hide a part of its force, and how short beside the time since the start of the stage
/// it is not.
const SHORTENING: f64 = 0.3;
const NARROWEST: f64 = 1e-9;

/// Share of a step within which a kink lies at its end: what the force is off there does not count.
const AT_AN_END: f64 = 1e-7;

/// The same share of the values of a switch, where a step was cut short at its kink: the next begins as far from it as the first was wrong.
const AFTER_KINK: f64 = 0.5;

/// How often a step that ended in NaN is tried again, each time ten times shorter.
const RETRIES_MAX: u32 = 60;

/// The `error` of a step that was lost at `last`, or that the force of `law` has no value close ahead.
fn lost(law: Option<&Law<f64>>, stage: usize, error: IntegrationError, last: State) -> IntegrationError {
    let ahead = (10..=45).rev().map(|power| f64::exp2(-f64::from(power))).flat_map(|part| {
        let deeper = State { depth: last.depth * (1.0 + part), ..last };
        [deeper, State { velocity: last.velocity * (1.0 - part), ..last }]
    });
    let place = |law: &Law<f64>| {
        let mut open = ahead.filter(|at| !law.force_value(at.depth, at.velocity).is_finite());
        open.next().map(|last| IntegrationError::NoForce { stage, why: law.explain(last.depth, last.velocity), last })
    };
    law.and_then(place).unwrap_or(error)
}

/// Solves stages with solvers that `make` makes.
struct SolverOf<'p, Eqn: OdeEquations, S, Make> {
    of: &'p OfScheme<Eqn>,
    /// Makes a solver with a first step of the length given, at the start that `force` holds.
    make: Make,
    /// Reused from stage to stage and flight to flight when explicit: all that a step reads is overwritten.
    reused: Option<S>,
    /// Room for interpolated states.
    scratch: Pair,
}

impl<'p, Eqn, S, Make> SolverOf<'p, Eqn, S, Make>
where
    Eqn: OdeEquations<T = f64, V = Pair>,
    S: OdeSolverMethod<'p, Eqn>,
    Make: Fn(f64) -> Result<S, DiffsolError>,
{
    /// A solver at `(xi, u)`, at time zero, about to try a step of length `h`; the law is already set.
    fn solver_at(&mut self, xi: f64, u: f64, h: f64) -> Result<S, DiffsolError> {
        self.of.force.start.set((xi, u));
        let Some(mut solver) = self.reused.take() else { return (self.make)(h) };
        let mut dy = [0.0; 2];
        self.of.force.rate(&[xi, u], &mut dy);
        let state = solver.state_mut();
        (state.y[0], state.y[1]) = (xi, u);
        (state.dy[0], state.dy[1]) = (dy[0], dy[1]);
        (*state.t, *state.h) = (0.0, h);
        Ok(solver)
    }

    fn solve(&mut self, stage: &Reduced, method: &Diffsol, course: &mut Course<'_>) -> Solved<StageEnd> {
        let law = stage.law;
        let &OfScheme { scheme, rtol, floor, ref force, .. } = self.of;
        force.law.set(stage.own.is_none().then_some(law));
        force.own.replace(stage.own.clone());
        force.evaluations.set(0);
        let longest_step = law.longest_step();
        let first_step = scheme.first_step_share(rtol) * law.shortest_time(stage.speed);
        let margin_error = scheme.margin_error(rtol);

        // Times of nodes count from the start of the present solver, which is at `epoch`.
        let mut before = Node { time: 0.0, depth: 0.0, velocity: stage.speed };
        let (mut epoch, mut h, mut retries) = (0.0, first_step, 0);
        let mut seen = Seen::from(stage);
        let mut cost = Cost::default();
        let state_at = |epoch: f64, at: Node| stage.state(Node { time: epoch + at.time, ..at });
        let (index, own) = (course.stage, course.law());
        let failure = |cause: DiffsolError, epoch: f64, at: Node| {
            let (cause, last) = (cause.to_string(), state_at(epoch, at));
            lost(own, index, IntegrationError::SolverFailed { method: method.name(), cause, last }, last)
        };
        let mut solver = self.solver_at(0.0, stage.speed, h).map_err(|e| failure(e, epoch, before))?;
        let mut rejected_before = rejected_by(&solver);

        let end = loop {
            if course.cost.steps + cost.steps >= method.max_steps {
                return Err(method.budget_spent(state_at(epoch, before)));
            }
            // The stop reason says nothing here: there is neither a root function nor a stop time.
            if let Err(cause) = solver.step() {
                if is_lost(before.velocity, floor * rtol, seen.energy_max) && stage.is_held(before) {
                    break StageEnd::Rest(Node { velocity: 0.0, ..before });
                }
                return Err(failure(cause, epoch, before));
            }
            let state = solver.state();
            let after = Node { time: state.t, depth: state.y[0], velocity: state.y[1] };
            let next_step = state.h;
            // Backwards with u > 0 at both ends: u was negative in between. Where it was lost in the tolerance already
            // (an explicit method at its stability limit), that is the rest; elsewhere the step was too long.
            let backwards = after.depth < before.depth && after.velocity > 0.0;
            if backwards && is_lost(before.velocity, floor * rtol, seen.energy_max) {
                cost.steps += 1;
                break StageEnd::Rest(before);
            }
            let is_lost_step = backwards || !(after.is_finite() && next_step.is_finite() && after.time > before.time);
            let shorter = if is_lost_step {
                retries += 1;
                if retries > RETRIES_MAX {
                    let last = state_at(epoch, before);
                    return Err(lost(own, index, IntegrationError::NotFinite { what: "the state", last }, last));
                }
                Some(0.1 * h)
            } else if let Some(own) = &stage.own {
                let scratch = &mut self.scratch;
                let at = |t| solver.interpolate_inplace(t, scratch).map(|()| [scratch[0], scratch[1]]);
                own.to_new_kink(&mut seen.kink, epoch, before, after, at).map_err(|e| failure(e, epoch, before))?
            } else {
                None
            };
            if let Some(shorter) = shorter {
                cost.rejected_steps += rejected_by(&solver) - rejected_before;
                drop(solver);
                h = shorter;
                epoch += before.time;
                before.time = 0.0;
                solver = self.solver_at(before.depth, before.velocity, h).map_err(|e| failure(e, epoch, before))?;
                rejected_before = rejected_by(&solver);
                cost.rejected_steps += 1;
                continue;
            }
            cost.steps += 1;
            let scratch = &mut self.scratch;
            let mut interpolant = |t| solver.interpolate_inplace(t, scratch).map(|()| (scratch[0], scratch[1]));
            let lost = course.error_bound + margin_error * seen.energy_max;
            let end = end_of_step(stage, force, course, lost, [before, after], &mut interpolant);
            let end = end.map_err(|e| failure(e, epoch, before))?;
            let place = end.map_or(after, StageEnd::state);
            if let Some(own) = &stage.own {
                own.note(&mut seen, [before, place], &mut interpolant).map_err(|e| failure(e, epoch, before))?;
            }
            let sampled = sample_inside(stage, course, epoch, [before, place], interpolant);
            sampled.map_err(|e| failure(e, epoch, before))?;
            seen.energy_max = seen.energy_max.max(place.velocity * place.velocity);
            if let Some(end) = end {
                break end;
            }
            before = after;
            course.sample(state_at(epoch, after));
            if let Some(end) = stage.own.as_ref().and_then(|own| own.end_of_slow(after, law.end)) {
                break end;
            }
            h = next_step;
            if h > longest_step {
                h = longest_step;
                *solver.state_mut().h = h;
            }
        };
        cost.rejected_steps += rejected_by(&solver) - rejected_before;
        cost.force_evaluations = force.evaluations.get();
        if !scheme.is_implicit() {
            self.reused = Some(solver);
        }
        course.cost = course.cost + cost;
        seen.widen_bound(course, stage, (scheme, rtol), cost.steps as f64);
        stage.end_of(course, end, epoch, margin_error)
    }
}

/// How the stage ends in the step between two nodes, if it does, for an error of `lost` in u².
fn end_of_step(
    stage: &Reduced,
    force: &Force,
    course: &mut Course<'_>,
    lost: f64,
    [before, after]: [Node; 2],
    mut interpolant: impl FnMut(f64) -> Result<(f64, f64), DiffsolError>,
) -> Result<Option<StageEnd>, DiffsolError> {
    let is_last = after.velocity <= 0.0 || after.depth >= stage.law.end;
    let end = is_last
        .then(|| locate(|x, v| force.force(&[x, v]), stage.law.end, before, after, &mut interpolant))
        .transpose()?;
    match &stage.own {
        Some(own) if own.law.end().is_some() => own.or_condition(course, lost, [before, after], end, interpolant),
        _ => Ok(end),
    }
}

/// Adds the states at the times asked for between two nodes, whose times count from `epoch`, by the library's `interpolant`.
#[inline]
fn sample_inside(
    stage: &Reduced,
    course: &mut Course<'_>,
    epoch: f64,
    [from, to]: [Node; 2],
    mut interpolant: impl FnMut(f64) -> Result<(f64, f64), DiffsolError>,
) -> Result<(), DiffsolError> {
    if !matches!(course.detail, Detail::Times(_)) {
        return Ok(());
    }
    let state = |at: Node| stage.state(Node { time: epoch + at.time, ..at });
    let mut lost = Ok(());
    course.sample_until(state(to), |time| {
        let local = (time - stage.start.time) / (stage.length / stage.unit_speed) - epoch;
        let local = local.max(from.time).min(to.time);
        let (depth, velocity) = interpolant(local).unwrap_or_else(|cause| {
            lost = Err(cause);
            (to.depth, to.velocity)
        });
        state(Node { time: local, depth, velocity })
    });
    lost
}

/// Whether speed `u` is lost in the tolerance where `energy_max` is the largest u² so far.
fn is_lost(u: f64, rtol: f64, energy_max: f64) -> bool {
    u <= 10.0 * rtol * energy_max.sqrt()
}

/// A step's end in the units of the stage: time, xi and u.
type Node = State;

/// Steps that the library threw away in the life of `solver`: error tests failed and Newton iterations without end.
fn rejected_by<'a, Eqn: OdeEquations + 'a, S: OdeSolverMethod<'a, Eqn>>(solver: &S) -> u64 {
    let statistics = solver.get_statistics();
    (statistics.number_of_error_test_failures + statistics.number_of_nonlinear_solver_fails) as u64
}

/// Where a step that ends with `u <= 0` or past the `distance` to the limit meets its event, on the library's interpolant `at`.
///
/// Rest is sought first. Up to there u > 0 and xi rises, so a boundary before it is crossed exactly once.
fn locate(
    force: impl Fn(f64, f64) -> f64,
    distance: f64,
    before: Node,
    after: Node,
    mut at: impl FnMut(f64) -> Result<(f64, f64), DiffsolError>,
) -> Result<StageEnd, DiffsolError> {
    let mut node_at = |time| at(time).map(|(xi, u)| Node { time, depth: xi, velocity: u });
    let mut last = after;
    if after.velocity <= 0.0 {
        let rest = bracketed_root(
            before,
            after,
            before.velocity,
            |node| (node.velocity, -force(node.depth, node.velocity)),
            &mut node_at,
        )?;
        last = Node { velocity: 0.0, ..rest };
    }
    if last.depth < distance {
        return Ok(StageEnd::Rest(last));
    }
    let boundary = bracketed_root(before, last, distance, |node| (node.depth - distance, node.velocity), &mut node_at)?;
    Ok(StageEnd::Limit(Node { depth: distance, velocity: boundary.velocity.max(0.0), ..boundary }))
}

/// Largest number of evaluations of [`bracketed_root`]; from half of them on the bracket is halved each time.
const ROOT_EVALUATIONS_MAX: u32 = 120;

/// Node of `at` where `f` is zero, between two nodes with values of opposite sign, zero counting as the second's.
///
/// `f` gives value and slope; `size` is what the value is rounded to the last place of. An evaluation of `at` costs as
/// much as a third of a step, and the slope by the law nothing: the slopes at both ends give a guess and Newton's method
/// the rest, two or three evaluations as a rule; where that leaves the bracket, the bracket is halved. No slope decides
/// that a root is reached, for an interpolant may be far from the law.
fn bracketed_root(
    before: Node,
    after: Node,
    size: f64,
    f: impl Fn(Node) -> (f64, f64),
    mut at: impl FnMut(f64) -> Result<Node, DiffsolError>,
) -> Result<Node, DiffsolError> {
    let (mut a, mut b, mut end) = (before.time, after.time, after);
    let ((fa, slope_a), (mut fb, slope_b)) = (f(before), f(after));
    // The rounding of the value, and of the time over the mean slope.
    let nothing = 2.0 * f64::EPSILON * (size + (b * (fb - fa) / (b - a)).abs());
    let mut guess = a + (b - a) * cubic_root(fa, fb, slope_a * (b - a), slope_b * (b - a));
    for evaluation in 0..ROOT_EVALUATIONS_MAX {
        if fb.abs() <= nothing || (b - a).abs() <= 2.0 * f64::EPSILON * a.abs().max(b.abs()) {
            break;
        }
        let is_inside = guess > a.min(b) && guess < a.max(b) && evaluation < ROOT_EVALUATIONS_MAX / 2;
        let t = if is_inside { guess } else { a + 0.5 * (b - a) };
        if t == a || t == b {
            break;
        }
        let node = at(t)?;
        let (ft, slope) = f(node);
        guess = t - ft / slope;
        if (ft < 0.0) != (fb < 0.0) {
            a = b;
        }
        (b, fb, end) = (t, ft, node);
    }
    Ok(end)
}

/// Root of the cubic with the values `f0` and `f1` and the slopes `d0` and `d1` at 0 and 1, by Newton's method: a guess,
/// which may be anything where that fails.
fn cubic_root(f0: f64, f1: f64, d0: f64, d1: f64) -> f64 {
    let (cubic, square) = (2.0 * (f0 - f1) + d0 + d1, 3.0 * (f1 - f0) - 2.0 * d0 - d1);
    let mut t = f0 / (f0 - f1);
    for _ in 0..6 {
        t -= (((cubic * t + square) * t + d0) * t + f0) / ((3.0 * cubic * t + 2.0 * square) * t + d0);
    }
    t
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
mod tests;
