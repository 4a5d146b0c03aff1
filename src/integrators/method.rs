//! The methods by name, the options each takes, and one place that builds them.

use std::fmt;

use strum::VariantArray;

use super::central_difference::{Boundaries, CentralDifference, Steps, VelocityAt};
use super::closed_form::ClosedForm;
#[cfg(feature = "diffsol")]
use super::diffsol::{Diffsol, Scheme};
use super::enclosure::Enclosure;
use super::energy::Energy;
use super::outcome::{Detail, Flight, IntegrationError, Integrator};
use super::taylor::Taylor;
use crate::physics::{Problem, Shown};

/// Names of the methods.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    serde::Deserialize,
    serde::Serialize,
    strum::Display,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[cfg_attr(feature = "report", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum MethodName {
    /// Adaptive high-order Taylor series, events by root isolation: the default.
    #[default]
    Taylor,
    /// Explicit Runge-Kutta 5(4) of Tsitouras (diffsol).
    Tsit45,
    /// Variable-order backward differentiation (diffsol): implicit, for driven stages.
    Bdf,
    /// Singly diagonal implicit Runge-Kutta of order 3 (diffsol): implicit.
    Esdirk34,
    /// TR-BDF2 (diffsol): implicit, of order 2.
    TrBdf2,
    /// Explicit or implicit for each stage, from a stated indicator (diffsol).
    Adaptive,
    /// W = V² over depth, integrated.
    Energy,
    /// Fixed-step central difference, the paper's scheme (Eq. 6-8).
    CentralDifference,
    /// The exact solution, where one exists.
    ClosedForm,
    /// Two numbers between which the exact answer lies, proved.
    Enclosure,
}

/// How accurate a method is, and which option says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accuracy {
    /// As good as the numbers allow, or within `--rtol` if one is given.
    RoundOff,
    /// As good as the numbers allow: a formula, or a proof.
    Exact,
    /// Within `--rtol`, by default [`RTOL_DEFAULT`].
    Tolerance,
    /// As good as the time step allows.
    Step,
}

impl MethodName {
    /// Every method, in the order of the help texts.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// How accurate the method is: what the options, the tests of every method, the suite and the benches ask.
    pub const fn accuracy(self) -> Accuracy {
        match self {
            Self::Taylor | Self::Energy => Accuracy::RoundOff,
            Self::ClosedForm | Self::Enclosure => Accuracy::Exact,
            Self::Tsit45 | Self::Bdf | Self::Esdirk34 | Self::TrBdf2 | Self::Adaptive => Accuracy::Tolerance,
            Self::CentralDifference => Accuracy::Step,
        }
    }

    /// The methods of this build, in the order of the help texts.
    pub fn built() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|name| name.is_built())
    }

    /// The relative error that the method promises without options: round-off, or a multiple of its tolerance per step.
    ///
    /// The multiples are those by which the adapter widens the library's local tolerance into an error bound.
    pub fn promise(self) -> f64 {
        self.promise_at(RTOL_DEFAULT)
    }

    /// The same of a library method at the tolerance `rtol`.
    pub fn promise_at(self, rtol: f64) -> f64 {
        match (self, self.accuracy()) {
            (Self::TrBdf2, _) => 3.0 * rtol.powf(2.0 / 3.0),
            (_, Accuracy::Tolerance) => 10.0 * rtol,
            _ => f64::EPSILON,
        }
    }

    /// Whether the method comes from the diffsol library.
    pub fn needs_diffsol(self) -> bool {
        matches!(self, Self::Tsit45 | Self::Bdf | Self::Esdirk34 | Self::TrBdf2 | Self::Adaptive)
    }

    /// Whether this build has the method.
    pub fn is_built(self) -> bool {
        cfg!(feature = "diffsol") || !self.needs_diffsol()
    }
}

/// Options of a method; each is refused by the methods that do not use it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MethodOptions {
    /// Relative tolerance, for methods whose [`Accuracy`] is `RoundOff` or `Tolerance`.
    pub rtol: Option<f64>,
    /// Time step (s), for `central-difference`; chosen from the stages when absent.
    pub dt: Option<f64>,
    /// Unequal steps in place of `dt`, for `central-difference`.
    pub steps: Option<Steps>,
    /// Velocity in the force, for `central-difference`.
    pub velocity: Option<VelocityAt>,
    /// Boundary rule, for `central-difference`.
    pub events: Option<Boundaries>,
}

impl MethodOptions {
    /// The central difference with these options.
    pub fn central_difference(&self) -> CentralDifference {
        CentralDifference {
            steps: self.steps.clone().unwrap_or_else(|| self.dt.map_or(Steps::Default, Steps::Uniform)),
            velocity: self.velocity.unwrap_or_default(),
            boundaries: self.events.unwrap_or_default(),
            ..CentralDifference::default()
        }
    }
}

/// Relative tolerance of a method that works to one, unless another is given.
pub const RTOL_DEFAULT: f64 = 1e-10;

/// Tolerances that any method is asked for.
const RTOL_ALLOWED: std::ops::RangeInclusive<f64> = 1e-15..=0.1;

/// A method with its options, ready to solve.
pub struct Method {
    name: MethodName,
    options: MethodOptions,
    integrator: Box<dyn Integrator + Send + Sync>,
}

/// Most stages behind the end of a flight that are named one by one.
const UNBUILT_MAX: usize = 64;

impl Method {
    /// The method `name` with `options`.
    ///
    /// # Errors
    /// [`IntegrationError::BadOption`] for an option that the method does not use or that is out of range,
    /// [`IntegrationError::Refused`] for a method that this build lacks.
    pub fn new(name: MethodName, options: &MethodOptions) -> Result<Self, IntegrationError> {
        let &MethodOptions { rtol, dt, velocity, events, ref steps } = options;
        let is_fixed_step = name.accuracy() == Accuracy::Step;
        refuse_unless(is_fixed_step, "--dt", dt.map(Shown), "only central-difference has a fixed step")?;
        let unequal = steps.as_ref().map(|steps| match steps {
            Steps::Automatic(safety) => format!("auto:{safety}"),
            _ => "of a table".to_owned(),
        });
        refuse_unless(is_fixed_step, "--steps", unequal, "only central-difference has this choice")?;
        refuse_unless(is_fixed_step, "--velocity", velocity, "only central-difference has this choice")?;
        refuse_unless(is_fixed_step, "--events", events, "only central-difference has this choice")?;
        let is_adaptive = matches!(name.accuracy(), Accuracy::RoundOff | Accuracy::Tolerance);
        refuse_unless(is_adaptive, "--rtol", rtol.map(Shown), "only adaptive methods have a tolerance")?;
        let is_tolerance = rtol.is_none_or(|rtol| RTOL_ALLOWED.contains(&rtol));
        refuse_unless(is_tolerance, "--rtol", rtol.map(Shown), "a number from 1e-15 to 0.1")?;
        let is_time = dt.is_none_or(|dt| dt.is_finite() && dt > 0.0);
        refuse_unless(is_time, "--dt", dt.map(Shown), "a time above zero, such as 1us or 1e-6")?;
        Ok(Self { name, options: options.clone(), integrator: integrator(name, options)? })
    }

    /// Its name.
    pub fn name(&self) -> MethodName {
        self.name
    }

    /// Whether it is the method `name` with no option set.
    pub fn is_plain(&self, name: MethodName) -> bool {
        self.name == name && self.options == MethodOptions::default()
    }

    /// What `problem` let this method skip on `flight`, and why.
    pub fn explain(&self, problem: &Problem, flight: &Flight, detail: Detail) -> Vec<String> {
        let mut notes = flight.notes.clone();
        notes.extend(self.integrator.explain(problem, flight));
        let left = flight.stage + 1..problem.stages.len();
        // Of very many, as of a table, the first stands for all.
        let listed = if left.len() > UNBUILT_MAX { 1 } else { left.len() };
        for index in left.clone().take(listed) {
            let stage = if listed < left.len() {
                format!("stages {index} to {}", left.end - 1)
            } else {
                format!("stage {index}")
            };
            let was = if listed < left.len() { "were" } else { "was" };
            notes.push(format!(
                "{stage} {was} not built: the flight ended in stage {} at x = {} m, before {} m",
                flight.stage,
                Shown(flight.end.depth),
                Shown(problem.start_of(index))
            ));
        }
        if !problem.has_exit() {
            notes.push("exit event not sought: the target has no far side".to_owned());
        } else if flight.outcome.is_stop() {
            notes.push("exit not located: rest comes first".to_owned());
        }
        if detail < Detail::Trajectory {
            notes.push("trajectory not kept: not asked for".to_owned());
        }
        if !self.name.needs_diffsol() || self.name == MethodName::Tsit45 {
            notes.push("Jacobian not built: the method is explicit or needs none".to_owned());
        }
        notes.push("sensitivities not computed: not asked for".to_owned());
        notes
    }

    /// The same method with another integrator, which `wrap` makes of its own.
    #[must_use]
    pub fn within(
        self,
        wrap: impl FnOnce(Box<dyn Integrator + Send + Sync>) -> Box<dyn Integrator + Send + Sync>,
    ) -> Self {
        Self { integrator: wrap(self.integrator), ..self }
    }

    /// The integrator inside.
    pub fn integrator(&self) -> &(dyn Integrator + Sync) {
        &*self.integrator
    }
}

/// The table of methods: the integrator of each name.
fn integrator(
    name: MethodName,
    options: &MethodOptions,
) -> Result<Box<dyn Integrator + Send + Sync>, IntegrationError> {
    Ok(match name {
        MethodName::Taylor => Box::new(options.rtol.map_or_else(|| Ok(Taylor::default()), Taylor::with_rtol)?),
        MethodName::Energy => Box::new(options.rtol.map_or_else(|| Ok(Energy::default()), Energy::with_rtol)?),
        MethodName::ClosedForm => Box::new(ClosedForm),
        MethodName::Enclosure => Box::new(Enclosure),
        MethodName::CentralDifference => Box::new(options.central_difference()),
        #[cfg(feature = "diffsol")]
        MethodName::Adaptive | MethodName::Tsit45 | MethodName::Bdf | MethodName::Esdirk34 | MethodName::TrBdf2 => {
            let scheme = Scheme::ALL.into_iter().find(|scheme| scheme.name() == name.name());
            Box::new(Diffsol { scheme, ..Diffsol::adaptive(options.rtol.unwrap_or(RTOL_DEFAULT)) })
        }
        #[cfg(not(feature = "diffsol"))]
        _ => {
            let why = "this build leaves out the diffsol library; build with `--features diffsol`".to_owned();
            return Err(IntegrationError::Refused { method: name.name(), why });
        }
    })
}

fn refuse_unless<T: fmt::Display>(
    used: bool,
    option: &'static str,
    value: Option<T>,
    allowed: &'static str,
) -> Result<(), IntegrationError> {
    match value {
        Some(value) if !used => Err(IntegrationError::bad_option(option, &value, allowed)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a panic is how a test fails")]
    use super::*;
    use crate::physics::Stage;

    const NAMES: &str = "taylor, tsit45, bdf, esdirk34, tr-bdf2, adaptive, energy, central-difference, closed-form, \
                         enclosure";

    fn slab(exit_depth: f64, speed: f64) -> Problem {
        let crater = Stage::crater(8e6, 0.1);
        Problem::crater_and_tunnel(2.0, speed, Some(crater), Stage::tunnel(1e5, 1.0)).with_exit(exit_depth)
    }

    #[test]
    fn every_method_has_its_name_and_reads_it_back() {
        let names: Vec<_> = MethodName::ALL.iter().map(ToString::to_string).collect();
        assert_eq!(names.join(", "), NAMES);
        for &name in MethodName::ALL {
            assert_eq!(name.name().parse(), Ok(name));
            let from_diffsol = ["tsit45", "bdf", "esdirk34", "tr-bdf2", "adaptive"].contains(&name.name());
            assert_eq!(name.needs_diffsol(), from_diffsol);
            assert_eq!(name.is_built(), cfg!(feature = "diffsol") || !from_diffsol);
            let method = Method::new(name, &MethodOptions::default()).ok();
            assert_eq!(method.map(|method| method.integrator().name()), name.is_built().then_some(name.name()));
        }
        assert!("euler".parse::<MethodName>().is_err());
    }

    #[test]
    fn an_option_reaches_the_methods_that_use_it_and_the_others_refuse_it() {
        let fixed = MethodOptions {
            steps: None,
            dt: Some(1e-5),
            velocity: Some(VelocityAt::Centred),
            events: Some(Boundaries::Interpolated),
            rtol: None,
        };
        let expected = CentralDifference {
            steps: Steps::Uniform(1e-5),
            velocity: VelocityAt::Centred,
            boundaries: Boundaries::Interpolated,
            ..CentralDifference::default()
        };
        assert_ne!(fixed.central_difference(), CentralDifference::default());
        assert_eq!(fixed.central_difference(), expected);
        let refused = |name: MethodName, options: &MethodOptions| match Method::new(name, options) {
            Err(IntegrationError::BadOption { option, .. }) => Some(option),
            Err(_) | Ok(_) => None,
        };
        let only = MethodOptions::default;
        for name in [MethodName::Taylor, MethodName::Energy, MethodName::ClosedForm, MethodName::CentralDifference] {
            let steps = name == MethodName::CentralDifference;
            let adapts = matches!(name, MethodName::Taylor | MethodName::Energy);
            for (option, options, used) in [
                ("--dt", MethodOptions { dt: fixed.dt, ..only() }, steps),
                ("--steps", MethodOptions { steps: Some(Steps::Automatic(0.9)), ..only() }, steps),
                ("--velocity", MethodOptions { velocity: fixed.velocity, ..only() }, steps),
                ("--events", MethodOptions { events: fixed.events, ..only() }, steps),
                ("--rtol", MethodOptions { rtol: Some(1e-6), ..only() }, adapts),
                ("--dt", MethodOptions { dt: Some(0.0), ..only() }, false),
                ("--rtol", MethodOptions { rtol: Some(0.2), ..only() }, false),
            ] {
                assert_eq!(refused(name, &options), (!used).then_some(option), "{name}, {options:?}");
            }
        }
    }

    #[test]
    fn it_is_said_what_was_skipped_and_why() {
        let explain = |name: MethodName, problem: &Problem, detail: Detail| {
            let method = Method::new(name, &MethodOptions::default()).unwrap();
            let flight = method.integrator().solve(problem, detail).unwrap();
            method.explain(problem, &flight, detail)
        };
        let closed_form = "no integration: the closed form";
        let no_jacobian = "Jacobian not built: the method is explicit or needs none";
        let no_sensitivities = "sensitivities not computed: not asked for";
        let no_trajectory = "trajectory not kept: not asked for";
        let rest_first = "exit not located: rest comes first";
        // At rest in the crater: V0/w = 0.05 m.
        let stopped = explain(MethodName::ClosedForm, &slab(0.3, 100.0), Detail::Events);
        let unbuilt = "stage 1 was not built: the flight ended in stage 0 at x = 0.05 m, before 0.1 m";
        assert_eq!(stopped, [closed_form, unbuilt, rest_first, no_trajectory, no_jacobian, no_sensitivities]);
        let endless = explain(MethodName::ClosedForm, &slab(f64::INFINITY, 400.0), Detail::Trajectory);
        let no_exit = "exit event not sought: the target has no far side";
        assert_eq!(endless, [closed_form, no_exit, no_jacobian, no_sensitivities]);
        let through = explain(MethodName::Taylor, &slab(0.3, 400.0), Detail::Trajectory);
        let shapes = [
            "stage 0: a spring alone: recurrence of one term, no convolution",
            "stage 1: no stiffness: V monotone, no search for hidden roots",
        ];
        assert_eq!(through, [shapes[0], shapes[1], no_jacobian, no_sensitivities]);
        // A flight that is over at impact has said so: no closed form was asked.
        let at_once = explain(MethodName::ClosedForm, &slab(0.0, 400.0), Detail::Events);
        assert!(!at_once.iter().any(|note| note == closed_form), "{at_once:?}");
        #[cfg(feature = "diffsol")]
        for (name, has_jacobian) in [(MethodName::Tsit45, false), (MethodName::Bdf, true), (MethodName::Adaptive, true)]
        {
            let notes = explain(name, &slab(0.3, 400.0), Detail::Events);
            assert_eq!(notes.iter().any(|note| note == no_jacobian), !has_jacobian, "{name}: {notes:?}");
        }
    }
}
