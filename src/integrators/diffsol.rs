//! The library methods: `tsit45`, `bdf`, `esdirk34` and `tr-bdf2` of the crate `diffsol`, behind one adapter.
//!
//! A flight is a chain of legs, one for each stage it meets. In a leg the law of the stage holds beyond both of its
//! ends, so the library integrates one smooth problem, in the stage's own units (depth L, speed V0, time L/V0):
//!
//! ```text
//! du/dtau = -(p + s xi + r u + q u²),  dxi/dtau = u,  xi(0) = 0,  until xi = distance or u = 0
//! ```
//!
//! `xi` counts from the start of the leg and L is the first boundary in x, the exit depth among them, or the leg where
//! that is shorter. In these units the absolute tolerances are both `rtol`, for every scene: one problem and one solver
//! serve a whole study, and only the four coefficients change.
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
//! | `dy` of the last leg survives a change of the law | it is computed anew with the new law; the law is set before a solver is made |
//! | Newton failures are counted over a solver's life and fail it at 50, a Jacobian outlives the law | an implicit solver lives for one leg |

use std::cell::{Cell, RefCell};

use diffsol::{
    DiffsolError, NalgebraContext, NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations, OdeSolverMethod,
    OdeSolverState, Tableau, Vector,
};

use super::outcome::{Cost, Detail, Events, Flight, IntegrationError, Integrator, Sample};
use crate::physics::exit_energy::{exit_margin, speed_missing};
use crate::physics::{Event, EventKind, Outcome, Problem, Stage, State};

type Matrix = NalgebraMat<f64>;
type Pair = NalgebraVec<f64>;
type Factors = NalgebraLU<f64>;

/// Steps a flight may take unless told otherwise.
pub const MAX_STEPS: u64 = 1_000_000;

/// A method of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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

    /// Name in the contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tsit45 => "tsit45",
            Self::Bdf => "bdf",
            Self::Esdirk34 => "esdirk34",
            Self::TrBdf2 => "tr-bdf2",
        }
    }

    /// Order of the solution carried on; `None` for a method of variable order.
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

    /// Error of W(exit)/V0² that the bar allows for each leg, in units of the largest V²/V0² of the leg.
    ///
    /// An error of energy never grows with depth, since resistance never falls with speed (`r, q >= 0`); so the bar
    /// grows with the number of steps, which a method of order k needs in proportion to `rtol^(-1/(k+1))`. In front
    /// stands a factor that is measured, on 1,200 random scenes for each of the tolerances 1e-3, 1e-6, 1e-8, 1e-10 and
    /// 1e-12; the worst of them came to 0.31 of the bar.
    fn margin_error(self, rtol: f64) -> f64 {
        match self {
            Self::Tsit45 => 6.0 * rtol,
            Self::Bdf => 6.0 * rtol.powf(5.0 / 6.0),
            Self::Esdirk34 => 4.0 * self.library_rtol(rtol).powf(3.0 / 4.0),
            Self::TrBdf2 => 3.0 * self.library_rtol(rtol).powf(2.0 / 3.0),
        }
    }

    /// The tolerance asked of the library.
    ///
    /// Tighter for the implicit Runge-Kutta methods, whose local errors add up over thousands of steps, so that at rtol
    /// 1e-12 they keep within 1e-9 in depth and 1e-8 in time. What decides is the time of rest of a viscous stage, where
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

    /// Share of the fastest time in a leg that the first step takes: the local error of a step of that length is
    /// about the tolerance.
    fn first_step_share(self, rtol: f64) -> f64 {
        let order = match self {
            Self::Tsit45 => 5.0,
            Self::Bdf => 1.0,
            Self::Esdirk34 => 3.0,
            Self::TrBdf2 => 2.0,
        };
        0.5 * self.library_rtol(rtol).powf(1.0 / (order + 1.0))
    }
}

/// A library method at a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffsol {
    /// The method.
    pub scheme: Scheme,
    /// Relative tolerance of each step, 1e-15 (`tsit45`) or 1e-14 to 0.1; the absolute ones are `rtol` times the first boundary in x
    /// (else the exit depth) and times V0.
    pub rtol: f64,
    /// Largest number of steps of one flight.
    pub max_steps: u64,
}

impl Diffsol {
    /// `scheme` at relative tolerance `rtol`, with [`MAX_STEPS`].
    pub fn new(scheme: Scheme, rtol: f64) -> Self {
        Self { scheme, rtol, max_steps: MAX_STEPS }
    }

    /// Flies many problems with one library problem and, where the scheme is explicit, one solver.
    ///
    /// `work` gets the function that flies one of them. A flight does not depend on the flights before it.
    ///
    /// # Errors
    /// `BadOption` for a tolerance outside its range; `SolverFailed` when the library refuses the problem.
    pub fn study<R>(&self, work: impl FnOnce(&mut FlyOne<'_>) -> R) -> Result<R, IntegrationError> {
        check_rtol(self.scheme, self.rtol)?;
        with_legs(self.scheme, self.rtol, |legs| {
            work(&mut |problem, detail| fly(problem, detail, self.scheme.name(), self.max_steps, legs))
        })
    }
}

/// Flies one problem of a study.
pub type FlyOne<'a> = dyn FnMut(&Problem, Detail) -> Result<Flight, IntegrationError> + 'a;

/// A study as an integrator.
pub(super) struct Kept<'a, 's> {
    name: &'static str,
    order: Option<u32>,
    fly_one: RefCell<&'a mut FlyOne<'s>>,
}

impl<'a, 's> Kept<'a, 's> {
    pub(super) fn new(of: &dyn Integrator, fly_one: &'a mut FlyOne<'s>) -> Self {
        Self { name: of.name(), order: of.order(), fly_one: RefCell::new(fly_one) }
    }
}

impl Integrator for Kept<'_, '_> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn order(&self) -> Option<u32> {
        self.order
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        (self.fly_one.borrow_mut())(problem, detail)
    }
}

impl Integrator for Diffsol {
    fn name(&self) -> &'static str {
        self.scheme.name()
    }

    fn order(&self) -> Option<u32> {
        self.scheme.order()
    }

    fn fly(&self, problem: &Problem, detail: Detail) -> Result<Flight, IntegrationError> {
        self.study(|fly_one| fly_one(problem, detail))?
    }

    fn keep(&self, work: &mut dyn FnMut(&dyn Integrator)) {
        // A method that cannot start says why in each of its flights.
        let _ = self.study(|fly_one| work(&Kept::new(self, fly_one)));
    }
}

/// Refuses a tolerance outside the range of `scheme`, NaN included.
pub(super) fn check_rtol(scheme: Scheme, rtol: f64) -> Result<(), IntegrationError> {
    if (scheme.rtol_min()..=0.1).contains(&rtol) {
        return Ok(());
    }
    let allowed = if scheme.is_implicit() { "1e-14 to 0.1" } else { "1e-15 to 0.1" };
    Err(IntegrationError::BadOption { option: "rtol", value: format!("{rtol:e}"), allowed })
}

/// The law of a stage in the units of a leg: `du/dtau = -(p + s xi + r u + q u²)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Law {
    /// Static deceleration at the start of the leg.
    p: f64,
    /// Stiffness over mass.
    s: f64,
    /// Viscosity over mass.
    r: f64,
    /// Drag over mass.
    q: f64,
}

impl Law {
    fn new(stage: &Stage, mass: f64, start: f64, units: &Units) -> Self {
        let Units { length, speed } = *units;
        Self {
            p: (stage.static_force + stage.stiffness * start) / mass * length / speed / speed,
            s: stage.stiffness / mass * (length / speed) * (length / speed),
            r: stage.viscosity / mass * (length / speed),
            q: stage.drag / mass * length,
        }
    }

    fn is_finite(&self) -> bool {
        self.p.is_finite() && self.s.is_finite() && self.r.is_finite() && self.q.is_finite()
    }

    #[inline]
    fn rate(&self, xi: f64, u: f64) -> f64 {
        -(self.p + self.s * xi + (self.r + self.q * u) * u)
    }

    /// The longest step that cannot hide two zeros of u: `1/w` for an underdamped spring, else none is needed.
    ///
    /// Between two zeros of u lies half a period, `pi/w` at least. Without a spring, or with an overdamped one, the
    /// static force at rest keeps its sign and u has one zero at most.
    fn longest_step(&self) -> f64 {
        if self.s > 0.0 && self.r * self.r < 4.0 * self.s { 1.0 / self.s.sqrt() } else { f64::INFINITY }
    }

    /// Whether nothing opposes a standstill at the place where the static force is zero, so that speed may run out
    /// with no force to end it: a static force of zero at the start of the leg, or a drive that fades and is overdamped.
    fn may_hang(&self) -> bool {
        self.p == 0.0 || (self.p < 0.0 && self.s > 0.0 && self.r * self.r >= 4.0 * self.s)
    }

    /// How far the projectile can still creep [L] where the static force does not stop it.
    fn reach(&self, at: Node) -> f64 {
        if self.p < 0.0 {
            if self.s > 0.0 { (-self.p / self.s - at.xi).max(0.0) } else { f64::INFINITY }
        } else if self.r > 0.0 {
            at.u / self.r
        } else {
            f64::INFINITY
        }
    }

    /// What `u = 0` is worth where rtol allows the library to be wrong by `noise`, relative: no force may have brought it
    /// about, but the tolerance alone.
    ///
    /// It is a rest where the static force resists. Elsewhere speed was lost in the tolerance. The boundary then
    /// counts as reached with no speed, so that the margin, zero within its bar, says `undecided`; out of reach, the
    /// place is approached for ever.
    fn settle(&self, end: LegEnd, at: Node, distance: f64, noise: f64) -> (LegEnd, Node) {
        if end != LegEnd::Rest {
            return (end, at);
        }
        let resists = self.p > 0.0 || (self.p == 0.0 && self.s > 0.0);
        let least_brake = if self.may_hang() { noise * (self.p.abs() + self.s * at.xi.abs()) } else { 0.0 };
        if resists || self.p + self.s * at.xi > least_brake {
            return (LegEnd::Rest, Node { xi: at.xi.max(0.0), u: 0.0, ..at });
        }
        let in_reach = distance - at.xi <= self.reach(at) + noise * (1.0 + at.xi.abs());
        if in_reach && distance.is_finite() {
            return (LegEnd::Boundary, Node { xi: distance, u: 0.0, ..at });
        }
        (LegEnd::Approach, at)
    }

    /// The shortest time in which something happens at speed `u` [L/V0].
    fn shortest_time(&self, u: f64, distance: f64) -> f64 {
        let rates = [
            u / distance.max(f64::MIN_POSITIVE),
            self.rate(0.0, u).abs() / u.max(f64::MIN_POSITIVE),
            self.p.abs(),
            self.s.sqrt(),
            self.r + 2.0 * self.q * u,
        ];
        let fastest = rates.into_iter().fold(0.0, f64::max);
        if fastest > 0.0 { (1.0 / fastest).max(f64::MIN_POSITIVE) } else { 1.0 }
    }
}

/// The units of a leg.
#[derive(Clone, Copy, Debug)]
struct Units {
    /// Depth L [m].
    length: f64,
    /// Speed V0 [m/s].
    speed: f64,
}

impl Units {
    /// First boundary in x, the exit depth among them, else the shortest length that the first stage's law has.
    fn of(problem: &Problem) -> Self {
        let speed = problem.impact_speed;
        let boundary = problem
            .stages
            .iter()
            .map(|stage| stage.end)
            .chain([problem.exit_depth])
            .filter(|&depth| depth > 0.0 && depth.is_finite())
            .reduce(f64::min);
        let law = problem.stages[0];
        let (m, w) = (problem.mass, speed * speed);
        let own = [
            m * w / (2.0 * law.static_force.abs()),
            speed * (m / law.stiffness).sqrt(),
            m * speed / law.viscosity,
            m / law.drag,
        ];
        let own = own.into_iter().filter(|length| length.is_finite() && *length > 0.0).fold(f64::INFINITY, f64::min);
        Self { length: boundary.unwrap_or(if own.is_finite() { own } else { 1.0 }), speed }
    }

    /// The state at `node` of a leg that began at `start`.
    fn state(&self, start: State, node: Node) -> State {
        State {
            time: start.time + node.time * (self.length / self.speed),
            depth: start.depth + node.xi * self.length,
            velocity: node.u * self.speed,
        }
    }
}

/// What one leg is asked to do.
pub(super) struct Leg {
    /// Index of the stage.
    pub(super) stage: usize,
    /// State at the start; moving.
    pub(super) start: State,
    /// The law in the units of the leg.
    law: Law,
    /// Speed at the start [V0].
    speed: f64,
    /// Distance to the next boundary [L]; infinite without one.
    distance: f64,
    /// Steps left.
    steps: u64,
    /// Whether a sentence about the choice of method is wanted.
    pub(super) explain: bool,
}

/// How a leg ended.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LegEnd {
    /// At the boundary.
    Boundary,
    /// At rest before it.
    Rest,
    /// Nothing stops it, and the boundary is out of reach: rest, or balance of drive and resistance, is approached.
    Approach,
    /// No step left.
    BudgetSpent,
    /// A number that is not finite, however short the step.
    NotFinite,
}

/// A finished leg.
pub(super) struct LegReport {
    /// How it ended.
    end: LegEnd,
    /// Time since the start of the leg [L/V0].
    time: f64,
    /// Distance flown [L].
    distance: f64,
    /// Speed at the end [V0].
    speed: f64,
    /// Work done.
    cost: Cost,
    /// Bar of u² [V0²] that this leg adds.
    error: f64,
    /// Why this method, where a choice was made.
    pub(super) note: Option<String>,
}

/// What the library said when it gave up, with time, distance and speed reached.
pub(super) struct LegFailure {
    cause: DiffsolError,
    at: Node,
}

/// Called with time, distance and speed at the end of each step.
pub(super) type Watch<'a> = dyn FnMut(f64, f64, f64) + 'a;

/// Flies one leg.
pub(super) type FlyLeg<'a> = dyn FnMut(&Leg, &mut Watch<'_>) -> Result<LegReport, LegFailure> + 'a;

/// The law that the library's closures read, and what they count.
#[derive(Default)]
struct Force {
    law: Cell<Law>,
    start: Cell<(f64, f64)>,
    evaluations: Cell<u64>,
}

impl Force {
    #[inline]
    fn rate(&self, y: &[f64], dy: &mut [f64]) {
        self.evaluations.set(self.evaluations.get() + 1);
        dy[0] = y[1];
        dy[1] = self.law.get().rate(y[0], y[1]);
    }

    #[inline]
    fn jacobian_product(&self, y: &[f64], v: &[f64], jv: &mut [f64]) {
        let law = self.law.get();
        jv[0] = v[1];
        jv[1] = -(law.s * v[0] + (law.r + 2.0 * law.q * y[1]) * v[1]);
    }

    fn start(&self, y: &mut [f64]) {
        (y[0], y[1]) = self.start.get();
    }
}

/// Builds the library's problem for `scheme` and hands what flies legs with it to `work`.
pub(super) fn with_legs<R>(
    scheme: Scheme,
    rtol: f64,
    work: impl FnOnce(&mut FlyLeg<'_>) -> R,
) -> Result<R, IntegrationError> {
    let failed = |cause: DiffsolError| IntegrationError::SolverFailed {
        method: scheme.name(),
        cause: cause.to_string(),
        last: State { time: 0.0, depth: 0.0, velocity: 0.0 },
    };
    let force = Force::default();
    let tolerance = scheme.library_rtol(rtol);
    let builder = OdeBuilder::<Matrix>::new().rtol(tolerance).atol([tolerance]);
    if scheme == Scheme::Tsit45 {
        let mut problem = builder
            .rhs(|y, _p, _t, dy| force.rate(y, dy))
            .init(|_p, _t, y| force.start(y), 2)
            .build()
            .map_err(failed)?;
        problem.ode_options.min_timestep = STEP_MIN;
        let tableau = Tableau::<f64>::tsit45();
        let make = |h: f64| {
            let mut state = problem.rk_state(&tableau)?;
            *state.as_mut().h = h;
            problem.tsit45_solver(state)
        };
        let mut legs = Legs::new(scheme, rtol, &force, make);
        return Ok(work(&mut |leg, watch| legs.fly(leg, watch)));
    }
    let mut problem = builder
        .rhs_implicit(|y, _p, _t, dy| force.rate(y, dy), |y, _p, _t, v, jv| force.jacobian_product(y, v, jv))
        .init(|_p, _t, y| force.start(y), 2)
        .build()
        .map_err(failed)?;
    problem.ode_options.min_timestep = STEP_MIN;
    // A failing step ends at `min_timestep`; a leg of many steps may meet more than the default of 50.
    problem.ode_options.max_nonlinear_solver_failures = usize::MAX;
    match scheme {
        Scheme::Tsit45 | Scheme::Bdf => {
            let make = |h: f64| {
                let mut state = problem.bdf_state::<Factors>()?;
                *state.as_mut().h = h;
                problem.bdf_solver::<Factors>(state)
            };
            let mut legs = Legs::new(scheme, rtol, &force, make);
            Ok(work(&mut |leg, watch| legs.fly(leg, watch)))
        }
        Scheme::Esdirk34 => {
            let tableau = Tableau::<f64>::esdirk34();
            let make = |h: f64| {
                let mut state = problem.rk_state(&tableau)?;
                *state.as_mut().h = h;
                problem.esdirk34_solver::<Factors>(state)
            };
            let mut legs = Legs::new(scheme, rtol, &force, make);
            Ok(work(&mut |leg, watch| legs.fly(leg, watch)))
        }
        Scheme::TrBdf2 => {
            let tableau = Tableau::<f64>::tr_bdf2();
            let make = |h: f64| {
                let mut state = problem.rk_state(&tableau)?;
                *state.as_mut().h = h;
                problem.tr_bdf2_solver::<Factors>(state)
            };
            let mut legs = Legs::new(scheme, rtol, &force, make);
            Ok(work(&mut |leg, watch| legs.fly(leg, watch)))
        }
    }
}

/// Shortest step [L/V0]. Each leg starts at time zero, so no time swallows it.
const STEP_MIN: f64 = 1e-30;

/// How often a step that ended in NaN is tried again, each time ten times shorter.
const RETRIES_MAX: u32 = 60;

/// Flies legs with solvers that `make` makes.
struct Legs<'f, S, Make> {
    scheme: Scheme,
    rtol: f64,
    force: &'f Force,
    /// Makes a solver with a first step of the length given, at the start that `force` holds.
    make: Make,
    /// Kept from leg to leg and flight to flight when explicit: all that a step reads is overwritten.
    kept: Option<S>,
    /// Room for interpolated states.
    scratch: Pair,
}

impl<'f, S, Make: Fn(f64) -> Result<S, DiffsolError>> Legs<'f, S, Make> {
    fn new(scheme: Scheme, rtol: f64, force: &'f Force, make: Make) -> Self {
        let scratch = Pair::zeros(2, NalgebraContext::default());
        Self { scheme, rtol, force, make, kept: None, scratch }
    }

    /// A solver at `(xi, u)`, at time zero, about to try a step of length `h`; the law is already set.
    fn solver_at<'a, Eqn>(&mut self, xi: f64, u: f64, h: f64) -> Result<S, DiffsolError>
    where
        Eqn: OdeEquations<T = f64, V = Pair> + 'a,
        S: OdeSolverMethod<'a, Eqn>,
    {
        self.force.start.set((xi, u));
        let Some(mut solver) = self.kept.take() else { return (self.make)(h) };
        let mut dy = [0.0; 2];
        self.force.rate(&[xi, u], &mut dy);
        let state = solver.state_mut();
        (state.y[0], state.y[1]) = (xi, u);
        (state.dy[0], state.dy[1]) = fault!("kink-derivative-kept", (dy[0], dy[1]), (state.dy[0], state.dy[1]));
        (*state.t, *state.h) = (0.0, h);
        Ok(solver)
    }

    fn fly<'a, Eqn>(&mut self, leg: &Leg, watch: &mut Watch<'_>) -> Result<LegReport, LegFailure>
    where
        Eqn: OdeEquations<T = f64, V = Pair> + 'a,
        S: OdeSolverMethod<'a, Eqn>,
    {
        let law = leg.law;
        self.force.law.set(law);
        self.force.evaluations.set(0);
        let longest_step = law.longest_step();
        let first_step = self.scheme.first_step_share(self.rtol) * law.shortest_time(leg.speed, leg.distance);

        // Times of nodes count from the start of the present solver, which is at `epoch`.
        let mut before = Node { time: 0.0, xi: 0.0, u: leg.speed };
        let mut epoch = 0.0;
        let mut h = first_step;
        let mut retries = 0;
        let mut energy_max = leg.speed * leg.speed;
        let mut cost = Cost::default();
        let failure = |cause, epoch: f64, at: Node| LegFailure { cause, at: Node { time: epoch + at.time, ..at } };
        let mut solver = self.solver_at(0.0, leg.speed, h).map_err(|e| failure(e, epoch, before))?;
        let mut rejected_before = rejected_by(&solver);

        let end = loop {
            if cost.steps >= leg.steps {
                break LegEnd::BudgetSpent;
            }
            // The stop reason says nothing here: there is neither a root function nor a stop time.
            let _ = solver.step().map_err(|e| failure(e, epoch, before))?;
            let state = solver.state();
            let after = Node { time: state.t, xi: state.y[0], u: state.y[1] };
            let next_step = state.h;
            // Backwards with u > 0 at both ends: u was negative in between. Where it was lost in the tolerance already
            // (an explicit method at its stability limit), that is the rest; elsewhere the step was too long.
            let backwards = after.xi < before.xi && after.u > 0.0;
            if backwards && is_lost(before.u, self.rtol, energy_max) {
                cost.steps += 1;
                break LegEnd::Rest;
            }
            if backwards || !(after.is_finite() && next_step.is_finite() && after.time > before.time) {
                retries += 1;
                if retries > RETRIES_MAX {
                    break LegEnd::NotFinite;
                }
                cost.rejected_steps += rejected_by(&solver) - rejected_before;
                drop(solver);
                h *= 0.1;
                epoch += before.time;
                before.time = 0.0;
                solver = self.solver_at(before.xi, before.u, h).map_err(|e| failure(e, epoch, before))?;
                rejected_before = rejected_by(&solver);
                cost.rejected_steps += 1;
                continue;
            }
            cost.steps += 1;
            if after.u <= 0.0 || after.xi >= leg.distance {
                let scratch = &mut self.scratch;
                let (end, place) = locate(&law, before, after, leg.distance, |t| {
                    solver.interpolate_inplace(t, scratch).map(|()| (scratch[0], scratch[1]))
                })
                .map_err(|e| failure(e, epoch, before))?;
                before = fault!("event-at-step-end", place, after);
                energy_max = energy_max.max(place.u * place.u);
                break end;
            }
            energy_max = energy_max.max(after.u * after.u);
            before = after;
            watch(epoch + after.time, after.xi, after.u);
            h = next_step;
            if h > longest_step {
                h = longest_step;
                *solver.state_mut().h = h;
            }
        };
        cost.rejected_steps += rejected_by(&solver) - rejected_before;
        cost.force_evaluations = self.force.evaluations.get();
        if !self.scheme.is_implicit() && end != LegEnd::NotFinite {
            self.kept = Some(solver);
        }
        let (end, place) = law.settle(end, before, leg.distance, self.scheme.margin_error(self.rtol));
        let round_off = 4.0 * f64::EPSILON * cost.steps as f64;
        Ok(LegReport {
            end,
            time: epoch + place.time,
            distance: place.xi,
            speed: place.u,
            error: (self.scheme.margin_error(self.rtol) + round_off) * energy_max,
            cost,
            note: None,
        })
    }
}

/// Whether speed `u` is lost in the tolerance where `energy_max` is the largest u² so far.
fn is_lost(u: f64, rtol: f64, energy_max: f64) -> bool {
    u <= 10.0 * rtol * energy_max.sqrt()
}

/// A step's end in the units of the leg.
#[derive(Clone, Copy, Debug)]
struct Node {
    time: f64,
    xi: f64,
    u: f64,
}

impl Node {
    fn is_finite(self) -> bool {
        self.time.is_finite() && self.xi.is_finite() && self.u.is_finite()
    }
}

/// Steps that the library threw away in the life of `solver`: error tests failed and Newton iterations without end.
fn rejected_by<'a, Eqn: OdeEquations + 'a, S: OdeSolverMethod<'a, Eqn>>(solver: &S) -> u64 {
    let statistics = solver.get_statistics();
    (statistics.number_of_error_test_failures + statistics.number_of_nonlinear_solver_fails) as u64
}

/// Where a step that ends with `u <= 0` or past `distance` meets its event, on the library's interpolant `at`.
///
/// Rest is sought first. Up to there u > 0 and xi rises, so a boundary before it is crossed exactly once.
fn locate(
    law: &Law,
    before: Node,
    after: Node,
    distance: f64,
    mut at: impl FnMut(f64) -> Result<(f64, f64), DiffsolError>,
) -> Result<(LegEnd, Node), DiffsolError> {
    let mut node_at = |time| at(time).map(|(xi, u)| Node { time, xi, u });
    let mut last = after;
    if after.u <= 0.0 {
        let rest = bracketed_root(before, after, before.u, |node| (node.u, law.rate(node.xi, node.u)), &mut node_at)?;
        last = Node { u: 0.0, ..rest };
    }
    if last.xi < distance {
        return Ok((LegEnd::Rest, last));
    }
    let boundary = bracketed_root(before, last, distance, |node| (node.xi - distance, node.u), &mut node_at)?;
    Ok((LegEnd::Boundary, Node { xi: distance, u: boundary.u.max(0.0), ..boundary }))
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

/// Flies `problem` leg by leg with `fly_leg`.
pub(super) fn fly(
    problem: &Problem,
    detail: Detail,
    method: &'static str,
    max_steps: u64,
    fly_leg: &mut dyn FnMut(&Leg, &mut Watch<'_>) -> Result<LegReport, LegFailure>,
) -> Result<Flight, IntegrationError> {
    if let Some(flight) = Flight::at_once(problem) {
        return Ok(flight);
    }
    let units = Units::of(problem);
    let mut course = Course::new(problem, detail);
    let mut outcome = None;
    let mut index = 0;
    while outcome.is_none() {
        let stage = &problem.stages[index];
        let limit = problem.limit_of(index);
        if limit > course.at.depth {
            let last = course.at;
            // What the tolerance leaves open in x must be little beside the leg: a thin rest of a slab is its own unit.
            let units = Units { length: units.length.min(limit - last.depth), ..units };
            let law = Law::new(stage, problem.mass, last.depth, &units);
            let distance = (limit - last.depth) / units.length;
            if !law.is_finite() || distance.is_nan() {
                return Err(IntegrationError::NotFinite { what: "the force over the mass", last });
            }
            if limit == f64::INFINITY && law.p <= 0.0 && law.s == 0.0 {
                return Err(IntegrationError::NeverEnds { why: "its last stage does not resist at rest", last });
            }
            let leg = Leg {
                stage: index,
                start: last,
                law,
                speed: last.velocity / units.speed,
                distance,
                steps: max_steps - course.cost.steps,
                explain: detail >= Detail::Events,
            };
            let report =
                fly_leg(&leg, &mut |time, xi, u| course.sample_step(index, &units, last, Node { time, xi, u }))
                    .map_err(|LegFailure { cause, at }| IntegrationError::SolverFailed {
                        method,
                        cause: cause.to_string(),
                        last: units.state(last, at),
                    })?;
            course.add(&report);
            let at = Node { time: report.time, xi: report.distance, u: report.speed };
            let reached = units.state(last, at);
            match report.end {
                LegEnd::Boundary => course.at = State { depth: limit, ..reached },
                LegEnd::Rest => {
                    course.at = State { depth: reached.depth.min(limit), velocity: 0.0, ..reached };
                    outcome = Some(problem.stop_in(index));
                }
                // Whether it gets there is lost in the tolerance: there without speed, the margin is zero within its bar.
                LegEnd::Approach
                    if is_near(problem.mass, stage, reached, limit, course.margin_error * units.speed.powi(2)) =>
                {
                    course.at = State { depth: limit, velocity: 0.0, ..reached };
                }
                LegEnd::Approach => {
                    return Err(IntegrationError::NeverEnds {
                        why: "it only approaches the place where nothing moves it on",
                        last: reached,
                    });
                }
                LegEnd::BudgetSpent => return Err(IntegrationError::StepBudgetSpent { max_steps, last: reached }),
                LegEnd::NotFinite => return Err(IntegrationError::NotFinite { what: "the state", last: reached }),
            }
        }
        if outcome.is_none() {
            if stage.end <= problem.exit_depth && stage.end.is_finite() {
                course.event(EventKind::boundary(problem, index), index);
            }
            if problem.exit_depth <= stage.end {
                course.event(EventKind::Exit, index);
                outcome = Some(Outcome::Perforated);
            } else if course.at.velocity <= 0.0 {
                outcome = Some(problem.stop_in(index));
            } else {
                index += 1;
            }
        }
    }
    let outcome = outcome.unwrap_or(Outcome::Undecided);
    if course.at.velocity <= 0.0 {
        course.event(EventKind::Rest, index);
    }
    Ok(course.finish(outcome, index))
}

/// Whether a flight that `stage` brings to nothing at `at` lacks no more of V² at `limit` than `bar` [m²/s²].
fn is_near(mass: f64, stage: &Stage, at: State, limit: f64, bar: f64) -> bool {
    let at = State { velocity: at.velocity.max(0.0), ..at };
    speed_missing(stage, mass, at, limit).is_some_and(|missing| missing * missing <= bar)
}

/// A flight under way.
struct Course<'p> {
    problem: &'p Problem,
    detail: Detail,
    at: State,
    events: Events,
    cost: Cost,
    margin_error: f64,
    trajectory: Vec<Sample>,
    notes: Vec<String>,
}

impl<'p> Course<'p> {
    fn new(problem: &'p Problem, detail: Detail) -> Self {
        let mut course = Self {
            problem,
            detail,
            at: State::at_impact(problem),
            events: Events::new(),
            cost: Cost::default(),
            margin_error: 0.0,
            trajectory: Vec::new(),
            notes: Vec::new(),
        };
        course.sample(0, course.at);
        course
    }

    fn sample(&mut self, stage: usize, state: State) {
        if self.detail == Detail::Trajectory {
            let force = self.problem.stages[stage].force(state.depth, state.velocity);
            self.trajectory.push(Sample { state, force, stage });
        }
    }

    fn sample_step(&mut self, stage: usize, units: &Units, start: State, node: Node) {
        if self.detail == Detail::Trajectory {
            self.sample(stage, units.state(start, node));
        }
    }

    fn event(&mut self, kind: EventKind, stage: usize) {
        self.events.push(Event { kind, state: self.at });
        self.sample(stage, self.at);
    }

    fn add(&mut self, report: &LegReport) {
        self.cost += report.cost;
        self.margin_error += report.error;
        if self.detail >= Detail::Events {
            self.notes.extend(report.note.clone());
        }
    }

    fn finish(mut self, outcome: Outcome, stage: usize) -> Flight {
        let exit_margin = exit_margin(self.problem, outcome, stage, self.at, &self.events);
        // A depth has 53 bits, and what is left of the target behind a stop may be no longer than its rounding.
        let Problem { mass, impact_speed, .. } = *self.problem;
        let force = self.problem.stages[stage].force(self.at.depth, 0.0).abs();
        let rounding = f64::EPSILON * (2.0 * force / mass) * self.at.depth / impact_speed / impact_speed;
        let bar = self.margin_error + if self.at.velocity > 0.0 { 0.0 } else { rounding };
        let exit_margin_error = exit_margin.map(|_| bar);
        let undecided = exit_margin.is_some_and(|margin| margin.abs() <= bar);
        if self.detail == Detail::End {
            self.events.retain(|event| matches!(event.kind, EventKind::Exit | EventKind::Rest));
        }
        Flight {
            outcome: if undecided { Outcome::Undecided } else { outcome },
            stage,
            end: self.at,
            events: self.events,
            exit_margin,
            exit_margin_error,
            cost: self.cost,
            trajectory: self.trajectory,
            step_limit: None,
            notes: self.notes,
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::physics::exit_energy::carry;
    use crate::physics::{Stages, Target};

    /// Numbers in [0, 1) from a seed (splitmix64).
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        }

        fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * self.unit()
        }

        fn log_between(&mut self, low: f64, high: f64) -> f64 {
            self.between(low.ln(), high.ln()).exp()
        }
    }

    fn stage(static_force: f64, stiffness: f64, viscosity: f64, drag: f64, end: f64) -> Stage {
        Stage { static_force, stiffness, viscosity, drag, end }
    }

    fn of_stages(mass: f64, impact_speed: f64, exit_depth: f64, stages: &[Stage]) -> Problem {
        let stages = Stages::from_slice(stages);
        Problem { mass, impact_speed, exit_depth, stages, crater: None, target: Target::Stages }
    }

    /// Crater with the continuous constant c, and tunnel (theory section 1).
    fn concrete(mass: f64, p: f64, q: f64, kd: f64, speed: f64, exit_depth: f64) -> Problem {
        let c = mass * (p + q * speed * speed) / (kd * (mass + kd * q));
        Problem {
            mass,
            impact_speed: speed,
            exit_depth,
            stages: Stages::from_slice(&[Stage::crater(c, kd), Stage::tunnel(p, q)]),
            crater: Some(0),
            target: Target::CraterAndTunnel,
        }
    }

    /// The scene `tunnel` of the comparison of solvers: stops at X = 0.14482620011221707, T = 8.2919669482493341e-4.
    fn tunnel_scene(exit_depth: f64) -> Problem {
        concrete(2.0, 848_230.016_469_244_3, 3.251_548_396_465_436, 0.1, 300.0, exit_depth)
    }

    const TUNNEL_DEPTH: f64 = 0.144_826_200_112_217_07;
    const TUNNEL_TIME: f64 = 8.291_966_948_249_334e-4;
    const TUNNEL_CRATER_TIME: f64 = 3.749_918_414_549_262e-4;
    const TUNNEL_CRATER_SPEED: f64 = 202.320_580_497_900_37;

    /// Margin by the exact energy law; for r = 0.
    fn exact_margin(problem: &Problem) -> f64 {
        let mut w = problem.impact_speed * problem.impact_speed;
        let (mut from, mut least) = (0.0, f64::INFINITY);
        for (index, law) in problem.stages.iter().enumerate() {
            let to = problem.limit_of(index).max(from);
            w = carry(law, problem.mass, w, from, to);
            least = least.min(w);
            from = to;
            if law.end >= problem.exit_depth {
                break;
            }
        }
        least / (problem.impact_speed * problem.impact_speed)
    }

    fn random_concrete(random: &mut Random) -> Problem {
        let d: f64 = random.log_between(0.01, 0.1);
        let p = random.log_between(1e7, 1e9) * d * d;
        let q = if random.unit() < 0.2 { 0.0 } else { random.log_between(1.0, 3000.0) * d * d };
        let mass = random.log_between(0.1, 1000.0) * 4000.0 * d * d * d;
        let kd = random.between(0.5, 3.0) * d;
        let i = random.log_between(0.05, 300.0);
        let speed = (i * p * d / mass).sqrt();
        let reach = concrete(mass, p, q, kd, speed, f64::INFINITY);
        // The exit near the depth of rest, in all degrees of nearness and on both sides.
        let w1 = carry(&reach.stages[0], mass, speed * speed, 0.0, kd);
        let x = if w1 > 0.0 {
            kd + if q > 0.0 { mass / (2.0 * q) * (q * w1 / p).ln_1p() } else { mass * w1 / (2.0 * p) }
        } else {
            speed * (mass / reach.stages[0].stiffness).sqrt()
        };
        let side = if random.unit() < 0.5 { 1.0 } else { -1.0 };
        let exit = x * (1.0 + side * random.log_between(1e-12, 0.9));
        concrete(mass, p, q, kd, speed, exit)
    }

    /// Up to five stages with jumps, gaps, springs, thin layers and drives.
    fn random_stages(random: &mut Random, viscous: bool) -> Problem {
        let count = 1 + (random.unit() * 5.0) as usize;
        let mut end = 0.0;
        let mut stages = Vec::new();
        for index in 0..count {
            end += random.log_between(1e-3, 1.0);
            let size = random.log_between(0.03, 3.0);
            let kind = random.unit();
            let (mut p, mut s, mut q, mut r) = (0.0, 0.0, 0.0, 0.0);
            if kind < 0.35 {
                p = size;
            } else if kind < 0.45 {
                p = -size;
            } else if kind < 0.55 {
                q = size;
            } else if kind < 0.65 {
                s = size;
            } else if kind < 0.9 {
                (p, s, q) = (size, random.log_between(0.1, 3.0), random.log_between(0.1, 3.0));
            } else if kind < 0.95 {
                (p, s) = (-size, size * random.log_between(0.1, 3.0));
            }
            if viscous && random.unit() < 0.7 {
                r = random.log_between(0.01, 30.0);
            }
            let last = index + 1 == count;
            stages.push(stage(p, s, r, q, if last { f64::INFINITY } else { end }));
        }
        let scale = random.log_between(1e-3, 1e6);
        for stage in &mut stages {
            stage.static_force *= scale;
            stage.stiffness *= scale;
            stage.viscosity *= scale;
            stage.drag *= scale;
        }
        of_stages(scale, random.log_between(0.3, 3.0), end * random.between(0.7, 1.0), &stages)
    }

    /// Largest |margin error| over its bar, for each scheme and tolerance; every scene must give a flight.
    fn worst_bar_shares(scenes: &[(Problem, f64)], rtols: &[f64]) -> Vec<(Scheme, f64, f64)> {
        let mut shares = Vec::new();
        for scheme in Scheme::ALL {
            for &rtol in rtols {
                let mut worst = 0.0_f64;
                let study = Diffsol::new(scheme, rtol).study(|fly| {
                    for (problem, exact) in scenes {
                        let flight = fly(problem, Detail::End).unwrap_or_else(|e| panic!("{e} {problem:?}"));
                        let error = (flight.exit_margin.unwrap() - exact).abs();
                        worst = worst.max(error / flight.exit_margin_error.unwrap());
                        let decided = flight.outcome != Outcome::Undecided;
                        assert!(!decided || (flight.outcome == Outcome::Perforated) == (*exact >= 0.0), "{problem:?}");
                    }
                });
                study.unwrap();
                println!("{:8} {rtol:7.0e}: {worst:.3} of the bar", scheme.name());
                shares.push((scheme, rtol, worst));
            }
        }
        shares
    }

    fn assert_bars(scenes: &[(Problem, f64)], rtols: &[f64]) {
        for (scheme, rtol, worst) in worst_bar_shares(scenes, rtols) {
            assert!(worst < 0.5, "{} at {rtol:e}: {worst} of the bar", scheme.name());
        }
    }

    fn with_margins(count: usize, mut scene: impl FnMut() -> Problem) -> Vec<(Problem, f64)> {
        (0..count).map(|_| scene()).map(|problem| (exact_margin(&problem), problem)).map(|(w, p)| (p, w)).collect()
    }

    /// Scenes with viscosity have no exact margin; a tighter flight stands for it.
    fn viscous_scenes(count: usize, random: &mut Random) -> Vec<(Problem, f64)> {
        let reference = Diffsol::new(Scheme::Tsit45, 1e-14);
        (0..count)
            .map(|_| random_stages(random, true))
            .filter_map(|problem| {
                let margin = reference.fly(&problem, Detail::End).ok()?.exit_margin?;
                Some((problem, margin))
            })
            .collect()
    }

    #[test]
    #[ignore = "a minute long in an unoptimized build; prints the figures behind `margin_error`"]
    fn exit_margin_keeps_within_half_its_bar_on_1200_scenes() {
        let mut random = Random(1);
        let rtols = [1e-3, 1e-6, 1e-8, 1e-10, 1e-12];
        assert_bars(&with_margins(400, || random_concrete(&mut random)), &rtols);
        assert_bars(&with_margins(400, || random_stages(&mut random, false)), &rtols);
        assert_bars(&viscous_scenes(400, &mut random), &rtols);
    }

    #[test]
    fn exit_margin_keeps_within_half_its_bar() {
        let mut random = Random(7);
        let rtols = [1e-4, 1e-7, 1e-9];
        assert_bars(&with_margins(60, || random_concrete(&mut random)), &rtols);
        assert_bars(&with_margins(60, || random_stages(&mut random, false)), &rtols);
        let viscous = viscous_scenes(60, &mut random);
        assert!(viscous.len() > 50);
        assert_bars(&viscous, &rtols);
    }

    #[test]
    fn no_bar_is_ten_times_too_wide() {
        let mut random = Random(1);
        let scenes = with_margins(150, || random_concrete(&mut random));
        for (scheme, rtol, worst) in worst_bar_shares(&scenes, &[1e-6, 1e-9]) {
            let least = if scheme == Scheme::TrBdf2 { 0.005 } else { 0.05 };
            assert!(worst > least, "{} at {rtol:e}: {worst} of the bar", scheme.name());
        }
    }

    /// `L(u) = log1p(u)/u`.
    fn log1p_over(u: f64) -> f64 {
        if u == 0.0 { 1.0 } else { u.ln_1p() / u }
    }

    /// Depth and time of rest of a crater and tunnel without exit (theory section 2).
    fn exact_rest(problem: &Problem) -> (f64, f64) {
        let (m, v0, c, kd) = (problem.mass, problem.impact_speed, problem.stages[0].stiffness, problem.stages[0].end);
        let (p, q) = (problem.stages[1].static_force, problem.stages[1].drag);
        let w = (c / m).sqrt();
        if v0 / w <= kd {
            return (v0 / w, std::f64::consts::FRAC_PI_2 / w);
        }
        let v1 = ((v0 - w * kd) * (v0 + w * kd)).sqrt();
        let a = v1 * (q / p).sqrt();
        let arctangent = if a == 0.0 { 1.0 } else { a.atan() / a };
        (kd + m * v1 * v1 / (2.0 * p) * log1p_over(a * a), (w * kd).atan2(v1) / w + m * v1 / p * arctangent)
    }

    #[test]
    fn rest_is_where_and_when_the_closed_form_says() {
        let mut random = Random(3);
        let scenes: Vec<_> = (0..60)
            .map(|_| Problem { exit_depth: f64::INFINITY, ..random_concrete(&mut random) })
            // Where V1 -> 0 the crater's time loses digits by itself (theory section 8); rest in the crater does not.
            .filter(|problem| {
                let w =
                    carry(&problem.stages[0], problem.mass, problem.impact_speed.powi(2), 0.0, problem.stages[0].end);
                (w / problem.impact_speed.powi(2)).abs() > 0.01
            })
            .collect();
        assert!(scenes.len() > 40);
        for scheme in Scheme::ALL {
            let (depth_limit, time_limit) = if scheme == Scheme::Tsit45 { (1e-11, 1e-10) } else { (1e-9, 1e-8) };
            let (mut depth_worst, mut time_worst) = (0.0_f64, 0.0_f64);
            let study = Diffsol::new(scheme, 1e-12).study(|fly| {
                for problem in &scenes {
                    let flight = fly(problem, Detail::Events).unwrap();
                    let (depth, time) = exact_rest(problem);
                    depth_worst = depth_worst.max((flight.end.depth / depth - 1.0).abs());
                    time_worst = time_worst.max((flight.end.time / time - 1.0).abs());
                }
            });
            study.unwrap();
            println!("{:8} depth {depth_worst:.1e} time {time_worst:.1e}", scheme.name());
            assert!(depth_worst < depth_limit, "{}: {depth_worst:e}", scheme.name());
            assert!(time_worst < time_limit, "{}: {time_worst:e}", scheme.name());
        }
    }

    #[test]
    fn crater_end_is_passed_when_and_as_fast_as_the_closed_form_says() {
        for scheme in Scheme::ALL {
            let limit = if scheme == Scheme::Tsit45 { 1e-10 } else { 1e-8 };
            let flight = Diffsol::new(scheme, 1e-12).fly(&tunnel_scene(f64::INFINITY), Detail::Events).unwrap();
            let crater = flight.crater_end().unwrap();
            assert_eq!(crater.depth, 0.1);
            assert!((crater.time / TUNNEL_CRATER_TIME - 1.0).abs() < limit, "{}: {crater}", scheme.name());
            assert!(((crater.velocity - TUNNEL_CRATER_SPEED) / 300.0).abs() < limit, "{}: {crater}", scheme.name());
            assert!((flight.end.depth / TUNNEL_DEPTH - 1.0).abs() < limit, "{}: {}", scheme.name(), flight.end);
            assert!((flight.end.time / TUNNEL_TIME - 1.0).abs() < limit, "{}: {}", scheme.name(), flight.end);
            assert_eq!(flight.outcome, Outcome::StoppedInTunnel);
        }
    }

    #[test]
    fn grazing_exits_are_never_called_stops_nor_near_stops_perforations() {
        // Q = 0 too: a constant force is integrated exactly, the step grows tenfold and jumps over the turning point.
        let no_drag = concrete(0.9, 245_000.0, 0.0, 0.0538, 390.0, f64::INFINITY);
        let depths = [(tunnel_scene(f64::INFINITY), TUNNEL_DEPTH), (no_drag.clone(), exact_rest(&no_drag).0)];
        for scheme in Scheme::ALL {
            for rtol in [1e-3, 1e-6, 1e-10, 1e-12] {
                for exponent in 1..=14 {
                    for (problem, rest) in &depths {
                        let gap = 0.1_f64.powi(exponent);
                        let at = |exit_depth| {
                            let problem = Problem { exit_depth, ..problem.clone() };
                            Diffsol::new(scheme, rtol).fly(&problem, Detail::Events).unwrap().outcome
                        };
                        let (short, long) = (at(rest * (1.0 - gap)), at(rest * (1.0 + gap)));
                        assert!(matches!(short, Outcome::Perforated | Outcome::Undecided), "{scheme:?} {rtol} {gap}");
                        assert!(long.is_stop() || long == Outcome::Undecided, "{scheme:?} {rtol} {gap}");
                        if gap > 100.0 * scheme.margin_error(rtol) {
                            assert_eq!(short, Outcome::Perforated, "{scheme:?} {rtol} {gap}");
                            assert!(long.is_stop(), "{scheme:?} {rtol} {gap}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn boundary_crossed_twice_within_a_step_is_found_at_its_first_crossing() {
        // xi = 2 t - t², u = 2 - 2 t: past 0.75 at t = 0.5, at rest past it at t = 1, back before it at t = 1.5.
        let law = Law { p: 2.0, ..Law::default() };
        let at = |t: f64| Ok((2.0 * t - t * t, 2.0 - 2.0 * t));
        let before = Node { time: 0.0, xi: 0.0, u: 2.0 };
        let after = Node { time: 1.9, xi: 0.19, u: -1.8 };
        let (end, place) = locate(&law, before, after, 0.75, at).unwrap();
        assert_eq!((end, place.xi), (LegEnd::Boundary, 0.75));
        assert!((place.time - 0.5).abs() < 1e-15 && (place.u - 1.0).abs() < 1e-15, "{place:?}");
        let (end, place) = locate(&law, before, after, 1.25, at).unwrap();
        assert_eq!((end, place.u), (LegEnd::Rest, 0.0));
        assert!((place.time - 1.0).abs() < 1e-15 && (place.xi - 1.0).abs() < 1e-15, "{place:?}");
        // Touching counts as reached.
        let (end, place) = locate(&law, before, after, 1.0, at).unwrap();
        assert_eq!(end, LegEnd::Boundary);
        assert!(place.u.abs() < 1e-7, "{place:?}");
    }

    #[test]
    fn bracketed_root_is_exact_for_flat_and_steep_functions_whatever_the_slopes() {
        let node = |time| Node { time, xi: 0.0, u: 0.0 };
        // A time of a millionth has its digits too: no absolute width ends the search.
        let f = |node: Node| (node.time - 3e-7, 0.0);
        let root = bracketed_root(node(0.0), node(1e-6), 0.0, f, |t| Ok(node(t))).unwrap();
        assert!((root.time / 3e-7 - 1.0).abs() < 1e-15, "{root:?}");
        for exponent in [1, 3, 9, 31] {
            let value = |t: f64| (t - 0.3).powi(exponent);
            let slope = |t: f64| f64::from(exponent) * (t - 0.3).powi(exponent - 1);
            // Right, wrong, far too flat or steep, and none.
            for share in [1.0, -3.0, 1e-3, 1e3, 1e300, 0.0, f64::INFINITY, f64::NAN] {
                let f = |node: Node| (value(node.time), share * slope(node.time));
                let mut evaluations = 0;
                let at = |t| {
                    evaluations += 1;
                    Ok(node(t))
                };
                let root = bracketed_root(node(0.0), node(1.0), 0.0, f, at).unwrap();
                assert!(value(root.time).abs() < 1e-15, "{exponent}, {share}: {}", root.time);
                assert!(evaluations <= ROOT_EVALUATIONS_MAX);
            }
        }
    }

    #[test]
    fn an_event_takes_few_evaluations_of_the_interpolant() {
        // u' = -(p + q u²) from u = 1 in one step past rest, and in one to a depth before it.
        let law = Law { p: 1.0, q: 0.5, ..Law::default() };
        let (root, speed) = (0.5_f64.sqrt(), 0.5_f64.sqrt().atan());
        let u = |t: f64| (speed - root * t).tan() / root;
        let xi = |t: f64| 2.0 * ((speed - root * t).cos() / speed.cos()).ln();
        let rest = speed / root;
        let node = |share: f64| Node { time: share * rest, xi: xi(share * rest), u: u(share * rest) };
        // Rest, a boundary well before it, and one that it has all but reached.
        for (after, distance, most) in [(1.05, 1.0, 3), (0.95, xi(0.9 * rest), 3), (1.05, 0.999 * xi(rest), 12)] {
            let mut evaluations = 0;
            let at = |t: f64| {
                evaluations += 1;
                Ok((xi(t), u(t)))
            };
            let (end, place) = locate(&law, node(0.8), node(after), distance, at).unwrap();
            assert_eq!(end, if distance == 1.0 { LegEnd::Rest } else { LegEnd::Boundary });
            let f = if distance == 1.0 { u(place.time) } else { xi(place.time) - distance };
            assert!(f.abs() < 1e-15, "{place:?}");
            assert!(evaluations <= most, "{after}, {distance}: {evaluations}");
        }
    }

    #[test]
    fn spring_stops_at_its_first_turning_point_even_at_a_tenth_of_accuracy() {
        for scheme in Scheme::ALL {
            // A far exit loosens the absolute tolerance of the depth, and with it the steps.
            for exit_depth in [f64::INFINITY, 1.0, 10.0, 100.0, 1e4] {
                let problem = of_stages(2.0, 3.0, exit_depth, &[stage(0.0, 50.0, 0.0, 0.0, f64::INFINITY)]);
                let flight = Diffsol::new(scheme, 0.1).fly(&problem, Detail::Events).unwrap();
                assert!((flight.end.depth / 0.6 - 1.0).abs() < 0.5, "{scheme:?} {exit_depth}: {}", flight.end);
                let time = std::f64::consts::FRAC_PI_2 / 5.0;
                assert!((flight.end.time / time - 1.0).abs() < 0.5, "{scheme:?} {exit_depth}: {}", flight.end);
            }
        }
    }

    #[test]
    fn no_step_on_a_spring_is_longer_than_the_longest() {
        // w = 5/s, driven: half a period lies before the turning point.
        let problem = of_stages(2.0, 0.01, 1e4, &[stage(-25.0, 50.0, 0.0, 0.0, f64::INFINITY)]);
        for scheme in Scheme::ALL {
            let flight = Diffsol::new(scheme, 0.1).fly(&problem, Detail::Trajectory).unwrap();
            let longest = flight.trajectory.windows(2).map(|rows| rows[1].state.time - rows[0].state.time);
            assert!(longest.fold(0.0, f64::max) <= 0.2 * (1.0 + 1e-12), "{scheme:?}");
            assert!(flight.outcome.is_stop() || flight.outcome == Outcome::Undecided, "{scheme:?}: {flight:?}");
        }
    }

    #[test]
    fn longest_step_holds_for_underdamped_springs_alone() {
        let law = |s, r| Law { p: 1.0, s, r, q: 0.0 };
        assert_eq!(law(4.0, 0.0).longest_step(), 0.5);
        assert_eq!(law(4.0, 3.9).longest_step(), 0.5);
        assert_eq!(law(4.0, 4.0).longest_step(), f64::INFINITY);
        assert_eq!(law(0.0, 0.0).longest_step(), f64::INFINITY);
    }

    #[test]
    fn flight_in_a_study_is_bit_equal_to_the_flight_alone() {
        let mut random = Random(11);
        let scenes: Vec<_> = (0..20).map(|_| random_stages(&mut random, true)).collect();
        for scheme in Scheme::ALL {
            let method = Diffsol::new(scheme, 1e-7);
            let together: Vec<_> =
                method.study(|fly| scenes.iter().map(|problem| fly(problem, Detail::Trajectory)).collect()).unwrap();
            for (problem, in_study) in scenes.iter().zip(together) {
                let alone = method.study(|fly| fly(problem, Detail::Trajectory)).unwrap();
                // A solver kept from flight to flight saves the two evaluations that making one takes.
                let without_cost = |flight: Flight| Flight { cost: Cost::default(), ..flight };
                assert_eq!(alone.map(without_cost), in_study.map(without_cost), "{scheme:?}");
            }
        }
    }

    #[test]
    fn detail_changes_what_is_listed_and_no_number() {
        for scheme in Scheme::ALL {
            let method = Diffsol::new(scheme, 1e-8);
            let [end, events, trajectory] = [Detail::End, Detail::Events, Detail::Trajectory]
                .map(|detail| method.fly(&tunnel_scene(0.12), detail).unwrap());
            assert_eq!((end.end, end.exit_margin, end.cost), (events.end, events.exit_margin, events.cost));
            assert_eq!((end.end, end.exit_margin, end.cost), (trajectory.end, trajectory.exit_margin, trajectory.cost));
            let kinds = |flight: &Flight| flight.events.iter().map(|event| event.kind).collect::<Vec<_>>();
            assert_eq!(kinds(&end), [EventKind::Exit]);
            assert_eq!(kinds(&events), [EventKind::CraterEnd, EventKind::Exit]);
            assert!(end.trajectory.is_empty() && events.trajectory.is_empty());
            // The impact, each step that ends without an event, and each event.
            assert_eq!(trajectory.trajectory.len() as u64, 1 + trajectory.cost.steps);
            assert!(trajectory.trajectory.windows(2).all(|rows| rows[0].state.time < rows[1].state.time));
        }
    }

    #[test]
    fn events_at_one_place_come_in_their_order() {
        let exit_at_crater_end = tunnel_scene(0.1);
        let flight = Diffsol::new(Scheme::Tsit45, 1e-10).fly(&exit_at_crater_end, Detail::Events).unwrap();
        let kinds: Vec<_> = flight.events.iter().map(|event| event.kind).collect();
        assert_eq!(kinds, [EventKind::CraterEnd, EventKind::Exit]);
        assert_eq!(flight.events[0].state, flight.events[1].state);
        // Inside the crater the exit comes alone.
        let flight = Diffsol::new(Scheme::Tsit45, 1e-10).fly(&tunnel_scene(0.05), Detail::Events).unwrap();
        assert!(flight.events.iter().map(|event| event.kind).eq([EventKind::Exit]));
        let empty_stages = of_stages(
            1.0,
            2.0,
            1.0,
            &[
                stage(1.0, 0.0, 0.0, 0.0, 0.0),
                stage(1.0, 0.0, 0.0, 0.0, 0.5),
                stage(9.0, 0.0, 0.0, 0.0, 0.5),
                stage(1.0, 0.0, 0.0, 0.0, f64::INFINITY),
            ],
        );
        let flight = Diffsol::new(Scheme::Bdf, 1e-10).fly(&empty_stages, Detail::Events).unwrap();
        let kinds: Vec<_> = flight.events.iter().map(|event| event.kind).collect();
        assert_eq!(kinds, [EventKind::StageEnd(0), EventKind::StageEnd(1), EventKind::StageEnd(2), EventKind::Exit]);
        assert_eq!(flight.stage, 3);
        assert!((flight.end.velocity - 2.0_f64.sqrt()).abs() < 1e-8, "{}", flight.end);
    }

    #[test]
    fn stage_that_is_not_reached_costs_nothing() {
        let mut problem = concrete(2.0, 848_230.0, 3.25, 0.1, 100.0, f64::INFINITY);
        problem.stages[1].static_force = f64::NAN;
        let flight = Diffsol::new(Scheme::Tsit45, 1e-10).fly(&problem, Detail::Events).unwrap();
        assert_eq!(flight.outcome, Outcome::StoppedInCrater);
    }

    #[test]
    fn flight_without_end_is_refused_with_the_state_reached() {
        let never = [
            stage(0.0, 0.0, 0.0, 0.0, f64::INFINITY),
            stage(0.0, 0.0, 0.0, 1.0, f64::INFINITY),
            stage(0.0, 0.0, 2.0, 0.0, f64::INFINITY),
            stage(-1.0, 0.0, 1.0, 1.0, f64::INFINITY),
            // Overdamped: it creeps towards x = 1.
            stage(-1.0, 1.0, 5.0, 0.0, f64::INFINITY),
        ];
        for law in never {
            for scheme in Scheme::ALL {
                let error = Diffsol::new(scheme, 1e-8)
                    .fly(&of_stages(1.0, 1.0, f64::INFINITY, &[law]), Detail::Events)
                    .unwrap_err();
                assert!(matches!(error, IntegrationError::NeverEnds { .. }), "{scheme:?} {law:?}: {error}");
            }
        }
        // Viscosity alone carries it to x = M V0/r = 0.5 and no further.
        for (exit_depth, reached) in [(0.499, true), (0.501, false)] {
            for scheme in Scheme::ALL {
                let problem = of_stages(1.0, 1.0, exit_depth, &[stage(0.0, 0.0, 2.0, 0.0, f64::INFINITY)]);
                match Diffsol::new(scheme, 1e-8).fly(&problem, Detail::Events) {
                    Ok(flight) => {
                        assert!(reached, "{scheme:?}: {flight:?}");
                        assert!((flight.end.velocity - 0.002).abs() < 1e-5, "{scheme:?}: {}", flight.end);
                    }
                    Err(IntegrationError::NeverEnds { last, .. }) => {
                        assert!(!reached && (last.depth - 0.5).abs() < 1e-5, "{scheme:?}: {last}");
                    }
                    Err(error) => panic!("{scheme:?}: {error}"),
                }
            }
        }
    }

    #[test]
    fn pure_drag_reaches_every_depth() {
        // V = V0 exp(-q x/M): exp(-3) of the speed is left; exp(-60) is below the tolerance, and said to be.
        for scheme in Scheme::ALL {
            let at = |exit_depth| {
                let problem = of_stages(1.0, 1.0, exit_depth, &[stage(0.0, 0.0, 0.0, 1.0, f64::INFINITY)]);
                Diffsol::new(scheme, 1e-8).fly(&problem, Detail::Events).unwrap()
            };
            assert!((at(3.0).end.velocity - (-3.0_f64).exp()).abs() < 1e-6, "{scheme:?}");
            assert_eq!(at(3.0).outcome, Outcome::Perforated);
            assert_eq!(at(60.0).outcome, Outcome::Undecided, "{scheme:?}");
        }
    }

    #[test]
    fn rest_that_an_explicit_step_hides_in_its_middle_is_found() {
        // Past rest the law would creep back at p/r, far below the tolerance: at the stability limit of the method u is
        // then positive at every step's end while xi falls for ever.
        let mut random = Random(5);
        for _ in 0..300 {
            let viscosity = random.log_between(3.0, 300.0);
            let law = stage(viscosity * random.log_between(1e-6, 1e-2), 0.0, viscosity, 0.0, f64::INFINITY);
            let method = Diffsol { max_steps: 1000, ..Diffsol::new(Scheme::Tsit45, 1e-3) };
            let flight = method.fly(&of_stages(1.0, 1.0, 1.0, &[law]), Detail::Events).unwrap();
            assert!(matches!(flight.outcome, Outcome::Stopped | Outcome::Undecided), "{law:?}: {flight:?}");
            let z = viscosity / law.static_force;
            let exact = (z - z.ln_1p()) / (z * viscosity);
            assert!((flight.end.depth - exact).abs() < 1e-2, "{law:?}: {} not {exact}", flight.end);
            assert!(flight.cost.rejected_steps < 1000, "{law:?}: {:?}", flight.cost);
        }
    }

    #[test]
    fn drive_whose_speed_is_lost_in_the_tolerance_is_undecided_and_no_stop() {
        // It leaves at the terminal velocity 1e-7 V0, which rtol 1e-3 cannot tell from rest.
        let problem = of_stages(1.0, 1.0, 0.02, &[stage(-1e-5, 0.0, 100.0, 0.0, f64::INFINITY)]);
        for scheme in Scheme::ALL {
            let flight = Diffsol::new(scheme, 1e-3).fly(&problem, Detail::Events).unwrap();
            assert_eq!(flight.outcome, Outcome::Undecided, "{scheme:?}: {flight:?}");
        }
    }

    #[test]
    fn overdamped_spring_that_only_resists_comes_to_rest_at_any_tolerance() {
        // Rest after ln(l1/l2)/(l1 - l2), about M V0/r deep: far below rtol times the exit depth.
        let problem = of_stages(1.0, 1.0, 5.0, &[stage(0.0, 1.0, 2e4, 0.0, f64::INFINITY)]);
        for scheme in Scheme::ALL {
            for rtol in [1e-2, 1e-3, 1e-6, 1e-9] {
                let flight = Diffsol::new(scheme, rtol).fly(&problem, Detail::Events).unwrap();
                assert_eq!(flight.outcome, Outcome::Stopped, "{scheme:?} {rtol}");
                assert!((flight.end.depth - 5e-5).abs() < 50.0 * rtol, "{scheme:?} {rtol}: {}", flight.end);
            }
        }
    }

    #[test]
    fn step_budget_is_kept_and_reported() {
        let method = Diffsol { max_steps: 5, ..Diffsol::new(Scheme::Bdf, 1e-10) };
        let error = method.fly(&tunnel_scene(f64::INFINITY), Detail::Events).unwrap_err();
        let IntegrationError::StepBudgetSpent { max_steps, last } = error else { panic!("{error}") };
        assert_eq!(max_steps, 5);
        assert!(last.depth > 0.0 && last.velocity > 0.0, "{last}");
    }

    #[test]
    fn force_beyond_the_range_of_numbers_is_an_error_and_no_nan() {
        // The coefficient over the mass is beyond the range; then each is within it and their sum is not.
        let over_mass = of_stages(1e-300, 1.0, 1.0, &[stage(1e300, 0.0, 0.0, 0.0, f64::INFINITY)]);
        let error = Diffsol::new(Scheme::Bdf, 1e-6).fly(&over_mass, Detail::End).unwrap_err();
        assert!(matches!(error, IntegrationError::NotFinite { what: "the force over the mass", .. }), "{error}");
        let problem = of_stages(1.0, 1.0, 1.0, &[stage(1.5e308, 0.0, 0.0, 1.5e308, f64::INFINITY)]);
        for scheme in Scheme::ALL {
            let error = Diffsol::new(scheme, 1e-6).fly(&problem, Detail::Events).unwrap_err();
            assert!(
                matches!(error, IntegrationError::NotFinite { .. } | IntegrationError::SolverFailed { .. }),
                "{scheme:?}: {error}"
            );
        }
    }

    #[test]
    fn tolerances_at_the_end_of_the_range_give_a_flight() {
        for scheme in Scheme::ALL {
            for rtol in [0.1, 1e-13, scheme.rtol_min()] {
                let flight = Diffsol::new(scheme, rtol).fly(&tunnel_scene(0.14), Detail::Events).unwrap();
                let error = (flight.exit_margin.unwrap() - exact_margin(&tunnel_scene(0.14))).abs();
                assert!(error < flight.exit_margin_error.unwrap(), "{scheme:?} {rtol}: {flight:?}");
                assert_eq!(flight.outcome == Outcome::Perforated, rtol < 1e-3, "{scheme:?} {rtol}");
            }
        }
    }

    #[test]
    fn tolerance_outside_its_range_is_refused() {
        for scheme in Scheme::ALL {
            for rtol in [0.0, -1e-6, 0.9 * scheme.rtol_min(), 0.11, f64::NAN, f64::INFINITY] {
                let error = Diffsol::new(scheme, rtol).fly(&tunnel_scene(0.1), Detail::End).unwrap_err();
                assert!(error.is_usage(), "{rtol}: {error}");
            }
        }
    }

    #[test]
    fn flight_that_ends_at_impact_takes_no_step() {
        let at_rest = Problem { impact_speed: 0.0, ..tunnel_scene(0.2) };
        let flight = Diffsol::new(Scheme::Esdirk34, 1e-8).fly(&at_rest, Detail::Events).unwrap();
        assert_eq!((flight.outcome, flight.cost), (Outcome::StoppedInCrater, Cost::default()));
    }

    const INF: f64 = f64::INFINITY;

    fn law(p: f64, s: f64, r: f64, q: f64) -> Law {
        Law { p, s, r, q }
    }

    #[test]
    fn a_kept_method_bears_the_name_and_the_order_of_the_method_and_flies_as_it_does() {
        let problem = of_stages(1.0, 2.0, INF, &[stage(3.0, 0.0, 1.0, 0.0, INF)]);
        let schemes = [
            (Scheme::Tsit45, "tsit45", Some(5)),
            (Scheme::Bdf, "bdf", None),
            (Scheme::Esdirk34, "esdirk34", Some(3)),
            (Scheme::TrBdf2, "tr-bdf2", Some(2)),
        ];
        for (scheme, name, order) in schemes {
            let method = Diffsol::new(scheme, 1e-6);
            let mut kept_once = 0;
            method.keep(&mut |kept| {
                kept_once += 1;
                for method in [&method, kept] {
                    assert_eq!((method.name(), method.order()), (name, order));
                }
                assert_eq!(
                    kept.fly(&problem, Detail::End).unwrap().end,
                    method.fly(&problem, Detail::End).unwrap().end
                );
            });
            assert_eq!(kept_once, 1);
        }
    }

    #[test]
    fn law_gives_force_per_mass_and_is_finite_only_as_a_whole() {
        assert_eq!(law(1.0, 2.0, 4.0, 5.0).rate(3.0, 6.0), -211.0);
        assert!(law(1.0, 2.0, 4.0, 5.0).is_finite());
        for place in 0..4 {
            let mut c = [1.0; 4];
            c[place] = INF;
            assert!(!law(c[0], c[1], c[2], c[3]).is_finite(), "{c:?}");
        }
    }

    #[test]
    fn only_an_underdamped_spring_bounds_the_step() {
        assert_eq!(law(-1.0, 4.0, 3.0, 0.0).longest_step(), 0.5);
        for unbounded in [law(0.0, 4.0, 4.0, 0.0), law(0.0, 4.0, 5.0, 0.0), law(-1.0, 0.0, 0.0, 1.0)] {
            assert_eq!(unbounded.longest_step(), INF, "{unbounded:?}");
        }
    }

    #[test]
    fn speed_hangs_where_no_static_force_is_left_and_a_creep_ends_where_the_drive_does() {
        for hangs in [law(0.0, 0.0, 1.0, 0.0), law(0.0, 4.0, 0.0, 0.0), law(-1.0, 4.0, 4.0, 0.0)] {
            assert!(hangs.may_hang(), "{hangs:?}");
        }
        for ends in [law(-1.0, 4.0, 3.0, 0.0), law(-1.0, 0.0, 1.0, 0.0), law(1.0, 4.0, 9.0, 0.0)] {
            assert!(!ends.may_hang(), "{ends:?}");
        }
        let at = |xi: f64, u: f64| Node { time: 0.0, xi, u };
        for (law, at, reach) in [
            (law(-8.0, 2.0, 1.0, 0.0), at(1.0, 3.0), 3.0),
            (law(-8.0, 2.0, 1.0, 0.0), at(5.0, 3.0), 0.0),
            (law(-8.0, 0.0, 1.0, 0.0), at(1.0, 3.0), INF),
            (law(0.0, 2.0, 2.0, 0.0), at(1.0, 3.0), 1.5),
            (law(0.0, 0.0, 0.0, 1.0), at(1.0, 3.0), INF),
        ] {
            assert_eq!(law.reach(at), reach, "{law:?}");
        }
    }

    #[test]
    fn first_step_is_a_share_of_the_fastest_time_that_keeps_its_local_error_at_the_tolerance() {
        for (law, u, distance, time) in [
            (law(0.0, 0.0, 0.0, 0.0), 2.0, 0.5, 0.25),
            (law(-3.0, 0.0, 0.0, 0.0), 1.0, INF, 1.0 / 3.0),
            (law(-3.0, 0.0, 0.0, 0.0), 0.5, INF, 1.0 / 6.0),
            (law(-3.0, 0.0, 0.0, 0.0), 2.0, INF, 1.0 / 3.0),
            (law(0.0, 25.0, 0.0, 0.0), 1.0, INF, 0.2),
            (law(0.0, 0.0, 1.0, 2.0), 3.0, INF, 1.0 / 13.0),
            (law(0.0, 0.0, 0.0, 0.0), 0.0, 1.0, 1.0),
        ] {
            assert_eq!(law.shortest_time(u, distance), time, "{law:?}, {u}");
        }
        // Orders 5, 1, 3 and 2, at the tolerance asked of the library.
        for (scheme, rtol, share) in [
            (Scheme::Tsit45, 1e-6, 0.05),
            (Scheme::Bdf, 1e-6, 0.0005),
            (Scheme::Esdirk34, 1e-3, 0.05),
            (Scheme::TrBdf2, 1e-2 / 3.0, 0.5 * 1e-4_f64.cbrt()),
        ] {
            let off = scheme.first_step_share(rtol) / share - 1.0;
            assert!(off.abs() < 1e-14, "{scheme:?}: {off:e}");
        }
    }

    #[test]
    fn unit_of_length_is_the_nearest_boundary_or_the_shortest_length_of_the_law() {
        let unit = |exit, stages: &[Stage]| Units::of(&of_stages(2.0, 3.0, exit, stages)).length;
        let still = stage(0.0, 0.0, 0.0, 0.0, INF);
        assert_eq!(unit(5.0, &[Stage { end: 0.0, ..still }, Stage { end: 4.0, ..still }, still]), 4.0);
        assert_eq!(unit(0.5, &[Stage { end: 4.0, ..still }, still]), 0.5);
        for (law, length) in [
            (stage(4.0, 0.0, 0.0, 0.0, INF), 2.25),
            (stage(-4.0, 0.0, 0.0, 0.0, INF), 2.25),
            (stage(0.0, 8.0, 0.0, 0.0, INF), 1.5),
            (stage(0.0, 0.0, 12.0, 0.0, INF), 0.5),
            (stage(0.0, 0.0, 0.0, 8.0, INF), 0.25),
            (stage(4.0, 8.0, 1.0, 0.0, INF), 1.5),
            (still, 1.0),
        ] {
            assert_eq!(unit(INF, &[law]), length, "{law:?}");
        }
        // M/q = 1e-330 m is less than any number.
        let light = Problem { mass: 1e-30, ..of_stages(1.0, 3.0, INF, &[stage(4.5e-30, 0.0, 0.0, 1e300, INF)]) };
        assert!((Units::of(&light).length - 1.0).abs() < 1e-15);
        let start = State { time: 1.0, depth: 10.0, velocity: 7.0 };
        let state = Units { length: 2.0, speed: 4.0 }.state(start, Node { time: 3.0, xi: 5.0, u: 6.0 });
        assert_eq!(state, State { time: 2.5, depth: 20.0, velocity: 24.0 });
    }

    #[test]
    fn standstill_is_a_rest_where_a_force_above_the_noise_holds_it() {
        let at = |xi: f64| Node { time: 1.0, xi, u: -1e-9 };
        let (rest, boundary, approach) = (LegEnd::Rest, LegEnd::Boundary, LegEnd::Approach);
        let noise = 0.01;
        for (law, xi, distance, end) in [
            // The static force resists from the start.
            (law(1.0, 0.0, 1.0, 0.0), 2.0, 9.0, rest),
            (law(0.0, 1.0, 1.0, 0.0), 2.0, 9.0, rest),
            // A drive that springs out of balance: -8 + 2 xi.
            (law(-8.0, 2.0, 1.0, 0.0), 4.01, 9.0, rest),
            (law(-8.0, 2.0, 1.0, 0.0), 3.99, 9.0, approach),
            (law(-8.0, 2.0, 1.0, 0.0), 3.99, 4.0, boundary),
            // Overdamped it may hang: the brake must exceed a hundredth of 8 + 2 xi.
            (law(-8.0, 2.0, 9.0, 0.0), 4.05, 9.0, approach),
            (law(-8.0, 2.0, 9.0, 0.0), 4.12, 9.0, rest),
            // Beyond its reach by the noise, a hundredth of 1 + xi, and by more.
            (law(-8.0, 2.0, 9.0, 0.0), 3.5, 4.044, boundary),
            (law(-8.0, 2.0, 9.0, 0.0), 3.5, 4.046, approach),
            (law(-8.0, 2.0, 9.0, 0.0), 1.0, 4.019, boundary),
            (law(-8.0, 2.0, 9.0, 0.0), 1.0, 4.022, approach),
            // A drive alone goes on for ever.
            (law(-8.0, 0.0, 1.0, 0.0), 1.0, 9.0, boundary),
            (law(-8.0, 0.0, 1.0, 0.0), 1.0, INF, approach),
        ] {
            let (found, place) = law.settle(rest, at(xi), distance, noise);
            assert_eq!(found, end, "{law:?}, {xi}, {distance}");
            let (depth, speed) = match end {
                LegEnd::Boundary => (distance, 0.0),
                LegEnd::Rest => (xi, 0.0),
                _ => (xi, -1e-9),
            };
            assert_eq!((place.xi, place.u), (depth, speed));
            assert_eq!(law.settle(LegEnd::BudgetSpent, at(xi), distance, noise).0, LegEnd::BudgetSpent);
        }
    }

    #[test]
    fn speed_is_lost_below_ten_tolerances_of_the_greatest() {
        assert!(is_lost(0.3, 0.01, 9.0) && !is_lost(0.31, 0.01, 9.0));
        assert!(is_lost(0.9e-5, 1e-6, 1.0) && !is_lost(1.1e-5, 1e-6, 1.0));
    }

    #[test]
    fn a_thin_rest_of_a_slab_behind_a_jump_of_force_is_crossed_or_undecided() {
        // The static force takes nearly all speed within a millionth of the depth flown before: V_r/V0 = 0.044.
        let m = 2.0;
        for exit_depth in [0.1 + 1e-7, 0.1 + 1e-6] {
            let stages =
                [stage(0.0, 1.0, 0.0, 0.0, 0.1), stage(848_230.0 * 1e-7 / (exit_depth - 0.1), 0.0, 0.0, 0.0, INF)];
            let (crater, tunnel) = (0.01, 2.0 * stages[1].static_force * (exit_depth - 0.1));
            for (factor, perforates) in [(1.0 + 1e-2, true), (1.0 - 1e-2, false)] {
                let speed = ((crater + tunnel) / m).sqrt() * factor;
                let problem = of_stages(m, speed, exit_depth, &stages);
                let margin = 1.0 - (crater + tunnel) / m / (speed * speed);
                for scheme in Scheme::ALL {
                    for rtol in [1e-3, 1e-5, 1e-6, 1e-8, 1e-10] {
                        let flight = Diffsol::new(scheme, rtol).fly(&problem, Detail::End).unwrap();
                        let (found, bar) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap());
                        assert!(
                            (found - margin).abs() <= bar,
                            "{scheme:?} at {rtol:e}: {found} +- {bar}, not {margin}"
                        );
                        let right = if perforates { Outcome::Perforated } else { Outcome::Stopped };
                        assert!([right, Outcome::Undecided].contains(&flight.outcome), "{scheme:?} at {rtol:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_bar_holds_the_rounding_of_a_depth_that_is_long_beside_what_is_left() {
        let mut random = Random(23);
        let mut stops = 0;
        for _ in 0..100 {
            // What is left after 0.1 MN over a tenth of a metre, taken within about a nanometre: 4e7 spacings of depth.
            let exit_depth: f64 = 0.1 + 1e-9;
            let force = 0.98e6 / (2.0 * (exit_depth - 0.1)) * random.between(0.9, 1.5);
            let stages = [stage(0.1e6, 0.0, 0.0, 0.0, 0.1), stage(force, 0.0, 0.0, 0.0, INF)];
            let problem = of_stages(1.0, 1e3, exit_depth, &stages);
            let margin = exact_margin(&problem);
            for scheme in Scheme::ALL {
                let flight = Diffsol::new(scheme, 1e-12).fly(&problem, Detail::End).unwrap();
                let (found, bar) = (flight.exit_margin.unwrap(), flight.exit_margin_error.unwrap());
                assert!((found - margin).abs() <= bar, "{scheme:?}: {found} +- {bar}, not {margin}");
                assert!(bar < 1e-6, "{scheme:?}: {bar}");
                stops += u32::from(flight.outcome == Outcome::Stopped);
            }
        }
        assert!(stops > 200, "{stops} stops");
    }

    #[test]
    fn a_leg_adds_to_the_bar_by_the_energy_that_is_left_at_its_start() {
        // W falls from 1 to 0.01 in the first metre: 50 N/kg of 99 percent of half V0².
        let stages = [stage(0.495, 0.0, 0.0, 0.0, 1.0), stage(1e-3, 0.0, 0.0, 0.0, INF)];
        for speed in [1.0, 1e3] {
            let stages = stages.map(|law| Stage { static_force: law.static_force * speed * speed, ..law });
            let problem = of_stages(1.0, speed, 2.0, &stages);
            for scheme in Scheme::ALL {
                let flight = Diffsol::new(scheme, 1e-6).fly(&problem, Detail::End).unwrap();
                let parts = flight.exit_margin_error.unwrap() / scheme.margin_error(1e-6);
                assert!((parts - 1.01).abs() < 1e-3, "{scheme:?}: {parts}");
            }
        }
    }

    #[test]
    fn an_explicit_flight_evaluates_the_force_once_a_leg_and_six_times_a_step_taken_or_not() {
        let mut random = Random(31);
        let mut rejected = 0;
        for _ in 0..100 {
            let problem = random_concrete(&mut random);
            for rtol in [1e-2, 1e-5, 1e-9] {
                let flight = Diffsol::new(Scheme::Tsit45, rtol).fly(&problem, Detail::Trajectory).unwrap();
                let Cost { steps, rejected_steps, force_evaluations } = flight.cost;
                let legs = 1 + flight.stage as u64;
                // One at the start of each leg, and one in which the library makes the first solver.
                assert_eq!(force_evaluations, 1 + legs + 6 * (steps + rejected_steps), "{:?}", flight.cost);
                // Impact, every step but the last of each leg, which ends in its event, and the events.
                let samples = 1 + steps - legs + flight.events.len() as u64;
                assert_eq!(flight.trajectory.len() as u64, samples, "{:?}", flight.events);
                rejected += rejected_steps;
            }
        }
        assert!(rejected > 0, "no step was rejected");
        // Speed that is lost in the tolerance ends a leg in a step that counts too.
        let problem = of_stages(1.0, 1.0, 1.0, &[stage(5.9e-7, 0.0, 1360.0, 0.0, INF)]);
        let flight = Diffsol::new(Scheme::Tsit45, 0.1).fly(&problem, Detail::Trajectory).unwrap();
        assert_eq!(flight.trajectory.len() as u64, flight.cost.steps + 1, "{:?}", flight.cost);
    }

    #[test]
    fn a_step_that_is_tried_again_is_counted_and_time_goes_on_from_where_it_began() {
        // A drag of 3e26/m beside a spring of 7e28/m²: the Newton iterations leave more of x open than a step moves.
        let problem =
            of_stages(1.0, 1.0, 1.0, &[stage(0.0, 6.859_735_044_546_989e28, 1.65, 2.987_378_155_631_558e26, INF)]);
        for scheme in [Scheme::Bdf, Scheme::Esdirk34] {
            let Ok(flight) = Diffsol::new(scheme, 1e-2).fly(&problem, Detail::Trajectory) else { panic!("{scheme:?}") };
            let rises = flight.trajectory.windows(2).all(|pair| pair[0].state.time <= pair[1].state.time);
            assert!(rises, "{scheme:?}");
            assert!(flight.cost.rejected_steps > 0, "{scheme:?}: {:?}", flight.cost);
        }
    }

    #[test]
    fn an_approach_that_the_bar_cannot_tell_from_arrival_is_undecided() {
        // 1 kg/s takes 1 m/s for each metre: from 0.5 m at 0.4 m/s to 1 m, 0.1 m/s are missing, 0.01 of V².
        let slowing = stage(0.0, 0.0, 1.0, 0.0, INF);
        let near = |velocity, bar| is_near(1.0, &slowing, State { time: 0.0, depth: 0.5, velocity }, 1.0, bar);
        assert!(near(0.4, 0.011) && !near(0.4, 0.009));
        // Speed below zero is the tolerance's, and none.
        assert!(near(-0.1, 0.26) && !near(-0.1, 0.24));

        // Behind a spring of 1 kN/m: V_c² = 1000/4 + 1/4.
        let stages = [stage(0.0, 1e3, 0.0, 0.0, 0.5), slowing];
        for scheme in Scheme::ALL {
            let mut undecided = 0;
            for power in 4..=14 {
                for sign in [1.0, -1.0] {
                    let speed = 250.25_f64.sqrt() * (1.0 + sign * 10f64.powi(-power));
                    match Diffsol::new(scheme, 1e-8).fly(&of_stages(1.0, speed, 1.0, &stages), Detail::End) {
                        Ok(Flight { outcome: Outcome::Undecided, .. }) => undecided += 1,
                        Ok(flight) => assert!(flight.outcome == Outcome::Perforated && sign > 0.0, "{scheme:?}"),
                        Err(IntegrationError::NeverEnds { .. }) => assert!(sign < 0.0, "{scheme:?}, 1e-{power}"),
                        Err(error) => panic!("{scheme:?}: {error}"),
                    }
                }
            }
            assert!(undecided >= 4, "{scheme:?}: {undecided}");
        }
    }
}
