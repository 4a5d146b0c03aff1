//! Laws of one's own: a force F(x, V) as an expression, a table of V or in code, in place of the four coefficients of a stage.
//!
//! A [`Problem`](super::Problem) holds them beside its stages. A stage with a law has NaN for coefficients, and a method
//! that knows no laws refuses the problem.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, LazyLock, Mutex, OnceLock, PoisonError};

use super::closed_form::Line;
use super::condition::Condition;
use super::expression::{Bound, Known, Tape, Unit, is_name};
use super::force_table::{Piece, SpeedTable};
use super::problem::{Stage, State};
use super::scalar::Scalar;
use super::units::Dimension;
use crate::text::Shown;

/// A force F(x, V) in code, for what an expression does not hold: a table of two variables, a model fitted to data.
///
/// Every method takes it but `taylor` and `energy`, which need the series of an expression, and the methods that are formulas.
/// What a step hides between the places at which a method asks for the force is not seen.
///
/// # Example
/// ```
/// use std::sync::Arc;
///
/// use penetrode::integrators::Diffsol;
/// use penetrode::physics::law::{ForceFunction, Law};
/// use penetrode::{Detail, Integrator, Problem, Stage};
///
/// /// A strength that grows by a tenth for each factor e of the velocity.
/// #[derive(Debug)]
/// struct Rate {
///     strength: f64,
/// }
///
/// impl ForceFunction for Rate {
///     fn force(&self, _x: f64, v: f64) -> f64 {
///         self.strength * (1.0 + 0.1 * (1.0 + v).ln())
///     }
/// }
///
/// let law = Law::of_code(Arc::new(Rate { strength: 848e3 }));
/// let problem = Problem::of_stages(2.0, 300.0, [Stage::free()]).with_law(0, &law);
/// let depth = Diffsol::adaptive(1e-10).solve(&problem, Detail::End)?.end.depth;
/// assert!((depth / 0.069_855_012_005_727_02 - 1.0).abs() < 1e-8, "{depth}");
/// # Ok::<(), penetrode::IntegrationError>(())
/// ```
pub trait ForceFunction: fmt::Debug + Send + Sync {
    /// Force (N) at depth `x` (m) and velocity `v` (m/s), `v >= 0`. Not finite: it has none there, and the flight ends
    /// with an error.
    fn force(&self, x: f64, v: f64) -> f64;

    /// Derivatives `F_x` (N/m) and `F_V` (N s/m), for implicit methods and error bounds: by differences, unless it says
    /// better.
    fn slopes(&self, x: f64, v: f64) -> (f64, f64) {
        let step = |at: f64| DIFFERENCE * at.abs().max(1e-3);
        let (dx, dv, low) = (step(x), step(v), (v - step(v)).max(0.0));
        let by_depth = (self.force(x + dx, v) - self.force(x - dx, v)) / (2.0 * dx);
        (by_depth, (self.force(x, v + dv) - self.force(x, low)) / (v + dv - low))
    }
}

/// Step of a difference over the place: the cube root of an epsilon.
const DIFFERENCE: f64 = 6e-6;

/// The force F(x, V) (N) of one stage, its parameters given.
#[derive(Clone, Debug, PartialEq)]
pub struct Law<S = f64> {
    force: Form<S>,
    /// Where the stage ends besides a depth.
    end: Option<Condition<S>>,
    /// The mass (kg) that joins the projectile where the stage begins, a function of x.
    joining: Option<(Tape, Vec<S>)>,
}

#[derive(Clone, Debug)]
enum Form<S> {
    Expression(Box<Expression<S>>),
    Code(Arc<dyn ForceFunction>),
    Table(Box<Pieces<S>>),
}

/// A table of velocity, and the laws of the pieces that a flight has come to: each smooth, and ending where the piece does.
#[derive(Clone, Debug)]
struct Pieces<S> {
    table: SpeedTable,
    /// Of each piece, for a velocity that falls and for one that rises.
    laws: Arc<[[OnceLock<Law<S>>; 2]]>,
}

#[derive(Clone, Debug)]
struct Expression<S> {
    parameters: Vec<S>,
    bound: Bound<S>,
    /// The same in values, for slopes.
    values: Bound,
    /// [`Law::by_square_of_v`], once it was asked for.
    parts: OnceLock<Option<Bound<S>>>,
}

impl<S: PartialEq> PartialEq for Form<S> {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Expression(one), Self::Expression(other)) => {
                one.parameters == other.parameters && one.values.tape() == other.values.tape()
            }
            (Self::Code(one), Self::Code(other)) => Arc::ptr_eq(one, other),
            (Self::Table(one), Self::Table(other)) => one.table == other.table,
            _ => false,
        }
    }
}

impl<S: Scalar> Law<S> {
    /// The law of `tape` at `parameters` (SI units), in the order of [`Tape::parameters`].
    pub fn new(tape: &Tape, parameters: Vec<S>) -> Self {
        let values: Vec<_> = parameters.iter().map(|parameter| parameter.value()).collect();
        let values = tape.bind(&values);
        let bound = tape.bind(&parameters);
        Self::of(Form::Expression(Box::new(Expression { parameters, bound, values, parts: OnceLock::new() })))
    }

    /// The law of a force in code.
    pub fn of_code(force: Arc<dyn ForceFunction>) -> Self {
        Self::of(Form::Code(force))
    }

    /// The law of a table of velocity.
    pub fn of_table(table: SpeedTable) -> Self {
        let laws = table.rows().windows(2).map(|_| Default::default()).collect();
        Self::of(Form::Table(Box::new(Pieces { table, laws })))
    }

    /// The table of velocity that it is, if it is one.
    pub fn table(&self) -> Option<&SpeedTable> {
        match &self.force {
            Form::Table(pieces) => Some(&pieces.table),
            Form::Expression(_) | Form::Code(_) => None,
        }
    }

    /// The line that it is, of a piece of a table of velocity ([`Law::piece`]).
    pub(crate) fn line(&self) -> Option<Line> {
        let Form::Expression(expression) = &self.force else { return None };
        let ([force, slope, velocity], true) = (&expression.parameters[..], expression.values.tape() == line()) else {
            return None;
        };
        let end = self.end.as_ref().and_then(Condition::speed).map(Scalar::value);
        Some(Line { force: force.value(), slope: slope.value(), velocity: velocity.value(), end })
    }

    /// The law of the piece of its table through which a projectile goes on from `v` (m/s): linear in V, and ending at the speed
    /// of the next row. `None` behind the last row, and for a law of another kind.
    pub(crate) fn piece(&self, v: f64) -> Option<&Self> {
        let Form::Table(pieces) = &self.force else { return None };
        let Piece { index, rises } = pieces.table.piece(v)?;
        let law = &pieces.laws[index][usize::from(rises)];
        Some(law.get_or_init(|| {
            let law = Self::new(line(), pieces.table.line(index).into());
            let rows = pieces.table.rows();
            let own_end = self.end.as_ref().and_then(Condition::speed).filter(|end| end.value() >= rows[index].at);
            match (rises, own_end) {
                (true, _) => law.ending(Condition::of_rise(S::decimal(rows[index + 1].at))),
                (false, Some(end)) => law.ending(Condition::of_speed(end, 0)),
                // The first row is rest.
                (false, None) if index == 0 => law,
                (false, None) => law.ending(Condition::of_speed(S::decimal(rows[index].at), 0)),
            }
        }))
    }

    fn of(force: Form<S>) -> Self {
        Self { force, end: None, joining: None }
    }

    /// The law of the coefficients of `stage`.
    pub(crate) fn of_coefficients(stage: &Stage<S>) -> Self {
        static TAPE: LazyLock<Option<Tape>> = LazyLock::new(|| {
            let known = [
                ("p", Dimension::Force),
                ("s", Dimension::Stiffness),
                ("r", Dimension::Viscosity),
                ("q", Dimension::Drag),
            ];
            let known = known.map(|(name, unit)| Known { name, value: 0.0, unit: unit.into() });
            Tape::read("p + s*x + r*V + q*V^2", &known, Dimension::Force.into()).ok()
        });
        let Stage { static_force, stiffness, viscosity, drag, .. } = *stage;
        match &*TAPE {
            Some(tape) => Self::new(tape, vec![static_force, stiffness, viscosity, drag]),
            None => unreachable!("the text of a force of coefficients is one"),
        }
    }

    /// The same law, of a stage that ends at `end` too.
    #[must_use]
    pub(crate) fn ending(mut self, end: Condition<S>) -> Self {
        if let Form::Expression(expression) = &mut self.force {
            expression.bound = expression.bound.with(end.tape(), end.parameters());
        }
        if let Form::Table(pieces) = &mut self.force {
            // Pieces that were made end without it.
            pieces.laws = pieces.table.rows().windows(2).map(|_| Default::default()).collect();
        }
        self.end = Some(end);
        self
    }

    /// The same law, of a stage at whose start a mass joins: the value of `tape` (kg) at `parameters`.
    #[must_use]
    pub(crate) fn joined_by(mut self, tape: &Tape, parameters: Vec<S>) -> Self {
        self.joining = Some((tape.clone(), parameters));
        self
    }

    /// Where the stage ends besides a depth.
    #[inline(always)]
    pub fn end(&self) -> Option<&Condition<S>> {
        self.end.as_ref()
    }

    /// The mass (kg) that joins the projectile where the stage begins, at depth `x` (m), and its derivative (kg/m).
    pub fn joining(&self, x: S) -> Option<(S, f64)> {
        let (tape, parameters) = self.joining.as_ref()?;
        let values: Vec<_> = parameters.iter().map(|parameter| parameter.value()).collect();
        let (_, slope, _) = tape.bind(&values).gradient(x.value(), 0.0);
        Some((tape.bind(parameters).eval(x, S::zero()), slope))
    }

    /// Force (N) at depth `x` (m) and velocity `v` (m/s); NaN or infinite where the expression has no value.
    pub fn force(&self, x: S, v: S) -> S {
        let code = match &self.force {
            Form::Expression(expression) => return expression.bound.eval(x, v),
            Form::Table(pieces) => return pieces.table.force(v),
            Form::Code(code) => code,
        };
        let (depth, velocity) = (x.value(), v.value());
        let force = S::from_f64(code.force(depth, velocity));
        if x.is_constant() && v.is_constant() {
            return force;
        }
        let (by_depth, by_velocity) = code.slopes(depth, velocity);
        let change = |at: S, slope: f64| (at - S::from_f64(at.value())) * S::from_f64(slope);
        force + change(x, by_depth) + change(v, by_velocity)
    }

    /// The same in values.
    #[inline]
    pub(crate) fn force_value(&self, x: f64, v: f64) -> f64 {
        match &self.force {
            Form::Expression(expression) => expression.values.eval(x, v),
            Form::Table(pieces) => pieces.table.force(v),
            Form::Code(code) => code.force(x, v),
        }
    }

    /// The expression with its parameters, for series; `None` for code and tables.
    pub(crate) fn bound(&self) -> Option<&Bound<S>> {
        self.expression().map(|expression| &expression.bound)
    }

    /// Of a force `p(x) + q(x) V²` without kinks: p as an expression of x, and q beside it.
    pub(crate) fn by_square_of_v(&self) -> Option<&Bound<S>> {
        let Expression { bound, parts, .. } = self.expression()?;
        parts.get_or_init(|| bound.switches().is_empty().then(|| bound.by_square_of_v()).flatten()).as_ref()
    }

    /// Of a law of velocity: the value of a switch, by its place among those of [`Law::bound`], and its derivative by V; NaN without.
    pub(crate) fn switch_over_velocity(&self, switch: usize, v: f64) -> (f64, f64) {
        let values = self.expression().map(|expression| expression.values.switch_over_velocity(switch, 0.0, v));
        values.unwrap_or((f64::NAN, f64::NAN))
    }

    fn expression(&self) -> Option<&Expression<S>> {
        match &self.force {
            Form::Expression(expression) => Some(expression),
            Form::Code(_) | Form::Table(_) => None,
        }
    }

    /// Bounds of the force between depths and velocities; those of code are not known.
    fn range(&self, x: (f64, f64), v: (f64, f64)) -> Option<(f64, f64)> {
        match &self.force {
            Form::Expression(expression) => Some(expression.values.range(x, v)),
            Form::Table(pieces) => Some(pieces.table.range(v)),
            Form::Code(_) => None,
        }
    }

    /// Why the force has no value at depth `x` (m) and velocity `v` (m/s).
    pub fn explain(&self, x: f64, v: f64) -> String {
        let unknown = "the number is beyond the range of 64 bits".to_owned();
        let values = match &self.force {
            Form::Expression(expression) => &expression.values,
            Form::Table(pieces) => return format!("its table ends at V = {} m/s", Shown(pieces.table.last())),
            Form::Code(_) => return format!("its code gives {}", self.force_value(x, v)),
        };
        let reason = values.explain(x, v).or_else(|| values.explain_series(x, v));
        reason.map_or(unknown, |error| format!("in {}, {}", error.term, error.reason))
    }

    /// Derivatives `F_x` (N/m) and `F_V` (N s/m).
    pub fn slopes(&self, x: f64, v: f64) -> (f64, f64) {
        match &self.force {
            Form::Code(code) => code.slopes(x, v),
            Form::Expression(_) | Form::Table(_) => (self.slope_over_depth(x, v), self.slope_over_velocity(x, v)),
        }
    }

    /// The first of [`Law::slopes`].
    pub(crate) fn slope_over_depth(&self, x: f64, v: f64) -> f64 {
        match &self.force {
            Form::Expression(expression) => expression.values.slope((x, 1.0), (v, 0.0)),
            Form::Table(_) => 0.0,
            Form::Code(code) => code.slopes(x, v).0,
        }
    }

    /// The second of [`Law::slopes`].
    pub(crate) fn slope_over_velocity(&self, x: f64, v: f64) -> f64 {
        match &self.force {
            Form::Expression(expression) => expression.values.slope((x, 0.0), (v, 1.0)),
            Form::Table(pieces) => pieces.table.slope(v),
            Form::Code(code) => code.slopes(x, v).1,
        }
    }

    /// `F_V` (kg/s) where it is below zero, else zero.
    pub(crate) fn fall_over_velocity(&self, x: f64, v: f64) -> f64 {
        let is_known = self.expression().is_some_and(|expression| expression.bound.never_falls_with_v());
        if is_known { 0.0 } else { self.slope_over_velocity(x, v).min(0.0) }
    }

    /// The side of each switch of min, max and abs at depth `x` (m) and velocity `v` (m/s).
    #[cfg(feature = "diffsol")]
    pub(crate) fn sides(&self, x: f64, v: f64) -> smallvec::SmallVec<[bool; 4]> {
        self.expression().map_or_else(smallvec::SmallVec::new, |expression| expression.values.sides(x, v))
    }

    /// Whether the force does not drive at rest, at 33 depths between two (m).
    pub(crate) fn resists_between(&self, from: f64, to: f64) -> bool {
        (0..=PANELS)
            .all(|panel| self.force_value(from + (to - from) * f64::from(panel) / f64::from(PANELS), 0.0) >= 0.0)
    }

    /// Whether bounds show that the force drives nowhere from the face to depth `to` (m), at any speed.
    pub(crate) fn never_drives(&self, to: f64) -> bool {
        self.range((0.0, to), (0.0, f64::INFINITY)).is_some_and(|(least, _)| least >= 0.0)
    }

    /// Whether bounds show that the force slows nothing from depth `from` (m) on, at any speed.
    pub(crate) fn never_slows(&self, from: f64) -> bool {
        self.range((from, f64::INFINITY), (0.0, f64::INFINITY)).is_some_and(|(_, most)| most <= 0.0)
    }

    /// Whether the ends of a path, depth (m) and velocity (m/s), show its force: it has a bound on a disc around the path, or the path
    /// comes close to rest, where there may be none, and the force goes but one way between them, or what may lie hidden is too little
    /// to count beside the `energy` (J). `at_kink`: as for [`Bound::is_shown_between`].
    #[cfg(feature = "diffsol")]
    pub(crate) fn is_shown_by(&self, ends: [(f64, f64); 2], at_kink: [f64; 2], energy: f64) -> bool {
        let between = |[from, to]: [f64; 2]| (from.min(to), from.max(to));
        let (depths, velocities) = (between(ends.map(|(x, _)| x)), between(ends.map(|(_, v)| v)));
        let bound = self.expression().map(|expression| &expression.values);
        if bound.is_some_and(|bound| bound.is_shown_between(ends, at_kink)) {
            return true;
        }
        let may_be_singular = bound.is_none() || velocities.0 <= CLOSE_TO_REST * velocities.1;
        let forces = ends.map(|(x, v)| self.force_value(x, v));
        let bounds = |low: f64| self.range(depths, (low, velocities.1)).map(|(least, most)| most - least);
        let Some(hidden) = bounds(velocities.0) else { return true };
        // A force without bound at rest: what a slower projectile meets is for the steps to come.
        let low = velocities.0.max(SLOWEST * velocities.1);
        let hidden = if hidden.is_finite() { hidden } else { bounds(low).unwrap_or(hidden) };
        let largest = forces[0].abs().max(forces[1].abs());
        (may_be_singular && hidden <= SURPRISE * largest + (forces[1] - forces[0]).abs())
            || hidden * (depths.1 - depths.0) <= NOTHING * energy
    }

    /// Whether the force is known to depend on the velocity alone.
    pub(crate) fn is_of_velocity(&self) -> bool {
        match &self.force {
            Form::Expression(expression) => !expression.values.tape().depends_on_x(),
            Form::Table(_) => true,
            Form::Code(_) => false,
        }
    }

    /// Whether the force depends on the velocity.
    pub fn depends_on_velocity(&self) -> bool {
        self.expression().is_none_or(|expression| expression.values.tape().depends_on_v())
    }

    /// Whether the force brings a projectile to rest at depth `x` (m) that comes there slower than `v` (m/s): it resists at
    /// rest, or vanishes as a power of V below the first (docs/theory.md, section 10).
    pub fn stops(&self, x: f64, v: f64) -> bool {
        let slow = 1e-8 * v;
        self.force_value(x, 0.0) > 0.0 || self.power(x, slow) < 1.0 - 1e-6
    }

    /// n of `F = a V^n` about velocity `v` (m/s).
    pub(crate) fn power(&self, x: f64, v: f64) -> f64 {
        (self.force_value(x, v) / self.force_value(x, 0.5 * v)).log2()
    }

    /// Whether a projectile of `mass` (kg), which is `at` a state with little of its speed left, will never come to rest
    /// before the limit, `distance` (m) ahead: its resistance vanishes with the velocity.
    pub(crate) fn is_approach(&self, mass: f64, at: State, distance: f64) -> bool {
        if self.stops(at.depth, at.velocity) || self.force_value(at.depth, at.velocity) <= 0.0 {
            return false;
        }
        let reach = self.reach(mass, at);
        reach < 0.5 * distance || (reach == f64::INFINITY && distance == f64::INFINITY)
    }

    /// How far (m) the projectile still gets from `at` where its resistance vanishes as a power of V: `F = a V^n` gives
    /// `M V²/((2 - n) F)` for 1 <= n < 2, and no bound for n >= 2 (docs/theory.md, section 10).
    pub(crate) fn reach(&self, mass: f64, at: State) -> f64 {
        if at.velocity <= 0.0 {
            return 0.0;
        }
        let (force, power) = (self.force_value(at.depth, at.velocity), self.power(at.depth, at.velocity));
        if power < 2.0 - 1e-9 { mass * at.velocity * at.velocity / ((2.0 - power) * force) } else { f64::INFINITY }
    }

    /// Exit margin of a rest before `exit` (m) where the force at rest is zero or infinite: `(X - H)/H`, its error that of the depth.
    ///
    /// `F = a V^n` leaves a distance that goes as `W^(1 - n/2)`, and so does the error of the depth; one below zero counts as n = 0.
    pub(crate) fn margin_of_depth(&self, rest: State, exit: f64, speed: f64, error_bound: f64) -> (f64, f64) {
        let power = self.power(rest.depth, 1e-8 * speed).clamp(0.0, 1.0);
        (rest.depth / exit - 1.0, 8.0 * (error_bound + f64::EPSILON).powf(1.0 - 0.5 * power))
    }

    /// Static work `integral of F(x, 0) dx` (J) between two depths (m), and the most of it in between.
    ///
    /// Up to the first place where the force has no value, where it has none: whoever gets further has come there before.
    pub fn static_work(&self, from: f64, to: f64) -> (f64, f64) {
        let work = self.work_between(from, to);
        if !work.0.is_nan() {
            return work;
        }
        let place = |panel: u32| from + (to - from) * f64::from(panel) / f64::from(PANELS);
        let has_value = |x: f64| self.force_value(x, 0.0).is_finite();
        let lost = (0..=PANELS).map(place).find(|x| !has_value(*x));
        let (mut known, mut lost) = (from, lost.unwrap_or(from));
        while lost - known > SAME_DEPTH * lost {
            let middle = 0.5 * (known + lost);
            if has_value(middle) { known = middle } else { lost = middle }
        }
        self.work_between(from, known)
    }

    fn work_between(&self, from: f64, to: f64) -> (f64, f64) {
        let force = |x: f64| self.force_value(x, 0.0);
        if self.is_of_velocity() {
            let work = force(from) * (to - from);
            return (work, work.max(0.0));
        }
        let bounds = |from: f64, to: f64| self.range((from, to), (0.0, 0.0)).unwrap_or((0.0, 0.0));
        if !matches!(self.force, Form::Code(_)) && bounds(from, to).0 >= 0.0 {
            // It drives nowhere, and no place has to be found.
            let rough = integral(&force, &bounds, (from, to), (0.0, 1e-6), HALVINGS);
            let work = integral(&force, &bounds, (from, to), (rough, 0.0), HALVINGS);
            return (work, work);
        }
        let place = |panel: u32| from + (to - from) * f64::from(panel) / f64::from(PANELS);
        let scale = (to - from) / f64::from(PANELS) * (0..PANELS).map(|panel| force(place(panel)).abs()).sum::<f64>();
        // Twice: what the points above miss may be all of it.
        let rough = |panel| integral(&force, &bounds, (place(panel), place(panel + 1)), (scale, 1e-6), HALVINGS).abs();
        let scale = scale + (0..PANELS).map(rough).sum::<f64>();
        let (mut work, mut most) = (0.0, 0.0_f64);
        for panel in 0..PANELS {
            let (from, to) = (place(panel), place(panel + 1));
            // Where the force begins to drive.
            let ends = if force(from) > 0.0 && force(to) < 0.0 { [sign_change(&force, from, to), to] } else { [to; 2] };
            for (from, to) in [(from, ends[0]), (ends[0], ends[1])] {
                work += integral(&force, &bounds, (from, to), (scale, 0.0), HALVINGS);
                most = most.max(work);
            }
        }
        (work, most)
    }

    /// The same law in another number type, parameters taken over by value.
    pub fn cast<T: Scalar>(&self) -> Law<T> {
        let to = |parameters: &[S]| parameters.iter().map(|p| T::from_f64(p.value())).collect::<Vec<_>>();
        let mut law = match &self.force {
            Form::Expression(expression) => Law::new(expression.bound.tape(), to(&expression.parameters)),
            Form::Table(pieces) => Law::of_table(pieces.table.clone()),
            Form::Code(code) => Law::of_code(Arc::clone(code)),
        };
        if let Some(end) = &self.end {
            law = law.ending(end.cast());
        }
        law.joining = self.joining.as_ref().map(|(tape, parameters)| (tape.clone(), to(parameters)));
        law
    }
}

/// The force between two rows of a table of velocity, of the row below: force f, slope r, velocity v.
fn line() -> &'static Tape {
    static TAPE: LazyLock<Option<Tape>> = LazyLock::new(|| {
        let known = [("f", Dimension::Force), ("r", Dimension::Viscosity), ("v", Dimension::Velocity)];
        let known = known.map(|(name, unit)| Known { name, value: 0.0, unit: unit.into() });
        Tape::read("f + r*(V - v)", &known, Dimension::Force.into()).ok()
    });
    match &*TAPE {
        Some(tape) => tape,
        None => unreachable!("the text of a line is an expression"),
    }
}

/// Name of a parameter. Names are few, and are kept as long as the program runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name(&'static str);

impl Name {
    /// The name `text`; `None` for a text that no expression could hold as a name.
    pub fn new(text: &str) -> Option<Self> {
        static KNOWN: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
        if !is_name(text) {
            return None;
        }
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(name) = known.get(text) {
            return Some(Self(name));
        }
        let name = Box::leak(text.to_owned().into_boxed_str());
        known.insert(name);
        Some(Self(name))
    }

    /// The name as text.
    pub fn text(self) -> &'static str {
        self.0
    }
}

/// A parameter of the forces of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnParameter {
    /// Its name.
    pub name: Name,
    /// Its value in SI units.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
}

/// Share of the velocity down to which discs around a path hold no rest.
#[cfg(feature = "diffsol")]
const CLOSE_TO_REST: f64 = 1.0 / 3.0;

/// Share of the greatest force of a path that roundings of its bounds may take; share of the energy that is nothing; and share of the
/// greatest velocity below which a force without bound is not asked.
#[cfg(feature = "diffsol")]
const SURPRISE: f64 = 1e-9;
#[cfg(feature = "diffsol")]
const NOTHING: f64 = 1e-18;
#[cfg(feature = "diffsol")]
const SLOWEST: f64 = 0.05;

/// Parts in which a stretch is searched for places where its force begins to drive.
const PANELS: u32 = 32;

/// Distance over the depth to which the place is found where a force has no value any more.
const SAME_DEPTH: f64 = 1e-12;

/// Halvings of a part of which the work is sought.
const HALVINGS: u32 = 30;

/// Nodes in (0, 1) and weights of Gauss and Legendre with ten points, the half below zero.
const GAUSS: [(f64, f64); 5] = [
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
];

/// Integral of `force` by ten points.
fn gauss(force: &impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    half * GAUSS.iter().map(|(x, w)| w * (force(middle - half * x) + force(middle + half * x))).sum::<f64>()
}

/// Integral of `force`: ten points, halved until both halves give the whole, and until its `bounds` leave room for little
/// else, beside the `scale` of the whole work; `roughly` is the share that may be wrong.
fn integral(
    force: &impl Fn(f64) -> f64,
    bounds: &impl Fn(f64, f64) -> (f64, f64),
    (from, to): (f64, f64),
    limits: (f64, f64),
    halvings: u32,
) -> f64 {
    refined(force, bounds, (from, to), gauss(force, from, to), limits, halvings)
}

/// The same, with what ten points give for the `whole`.
fn refined(
    force: &impl Fn(f64) -> f64,
    bounds: &impl Fn(f64, f64) -> (f64, f64),
    (from, to): (f64, f64),
    whole: f64,
    (scale, roughly): (f64, f64),
    halvings: u32,
) -> f64 {
    let middle = 0.5 * (from + to);
    let (left, right) = (gauss(force, from, middle), gauss(force, middle, to));
    let (least, most) = bounds(from, to);
    let hides_little = (most - least) * (to - from) <= (left + right).abs() + 0.02 * scale;
    let is_exact = !((left + right - whole).abs() > 1e-15 * scale + roughly * (left.abs() + right.abs()));
    // No halving makes a number of a sum that is none.
    let is_enough = is_exact && hides_little || !(left + right).is_finite();
    if is_enough || halvings == 0 {
        return left + right;
    }
    let part = |from, to, whole| refined(force, bounds, (from, to), whole, (scale, roughly), halvings - 1);
    part(from, middle, left) + part(middle, to, right)
}

/// Where `force`, positive at `low` and negative at `high`, changes its sign.
fn sign_change(force: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if force(middle) > 0.0 { low = middle } else { high = middle }
    }
    high
}

/// The laws of the stages of a problem; nothing where all have coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Laws<S = f64>(Option<Arc<[Option<Law<S>>]>>);

impl<S> Laws<S> {
    /// No law: every stage has coefficients.
    pub const fn none() -> Self {
        Self(None)
    }

    /// Whether every stage has coefficients.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// Whether a stage ends at a speed or on a condition, or a mass joins at the start of one.
    pub fn have_conditions(&self) -> bool {
        let is_plain = |law: &Law<S>| law.end.is_none() && law.joining.is_none();
        self.0.as_ref().is_some_and(|laws| !laws.iter().flatten().all(is_plain))
    }

    /// The law of stage `index`; `None` for one of coefficients.
    #[inline(always)]
    pub fn of(&self, index: usize) -> Option<&Law<S>> {
        match &self.0 {
            None => None,
            Some(laws) => laws.get(index)?.as_ref(),
        }
    }
}

impl<S: Scalar> Laws<S> {
    /// These laws, and `law` for stage `index`.
    #[must_use]
    pub fn with(&self, index: usize, law: &Law<S>) -> Self {
        let known = self.0.as_ref().map_or(0, |laws| laws.len());
        let laws = (0..known.max(index + 1)).map(|i| if i == index { Some(law.clone()) } else { self.of(i).cloned() });
        laws.collect()
    }

    /// The same laws in another number type.
    pub fn cast<T: Scalar>(&self) -> Laws<T> {
        let cast = |laws: &Arc<[Option<Law<S>>]>| laws.iter().map(|law| law.as_ref().map(Law::cast)).collect();
        Laws(self.0.as_ref().map(cast))
    }
}

impl<S> FromIterator<Option<Law<S>>> for Laws<S> {
    fn from_iter<I: IntoIterator<Item = Option<Law<S>>>>(laws: I) -> Self {
        let laws: Arc<[_]> = laws.into_iter().collect();
        Self(laws.iter().any(Option::is_some).then_some(laws))
    }
}
