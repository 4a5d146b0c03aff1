//! Verification engine for the equation of motion of a rigid projectile in concrete.
//!
//! A projectile of mass M strikes concrete at velocity V0. Where does it stop, when, or how fast does it leave?
//!
//! ```text
//! M dV/dt = -F(x, V),  dx/dt = V,  x(0) = 0,  V(0) = V0
//! crater  0 <= x < k d :  F = c x                 (Eq. 4)
//! tunnel  k d <= x     :  F = P + Q V²            (Eq. 5)
//! ```
//!
//! Here stand nine integrators of this equation, its closed form, its solution in 50 digits, proved enclosures, and the studies that show
//! whether an integrator, ours or yours, is right: orders of convergence, critical velocity, cost against error. Every
//! stage of the target is `F = p + s x + r V + q V²`, so layers, air gaps and springs are the same problem.
//!
//! # In a minute
//!
//! **Solve a scene.** Numbers carry their units.
//!
//! ```
//! use penetrode::{Detail, Integrator, Scene, Taylor};
//!
//! let scene = Scene::from_toml(r#"
//!     projectile = { mass = "2 kg", diameter = "50 mm", nose = { factor = 0.72 } }
//!     target = { strength = "36 MPa", density = "2300 kg/m^3", thickness = "180 mm" }
//!     resistance = { S = 12.0, B = 1.0, k = 2.0 }
//!     impact = { velocity = "400 m/s" }
//! "#, "slab.toml")?;
//! let flight = Taylor::default().solve(&scene.problem()?, Detail::Events)?;
//!
//! let end = format!("{} at {:.3} m/s after {:.1} µs", flight.outcome, flight.end.velocity, 1e6 * flight.end.time);
//! assert_eq!(end, "perforated at 135.009 m/s after 628.1 µs");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Critical velocity**, the least that perforates, with its error bound. Without a file, a problem is a list of stages.
//!
//! ```
//! use penetrode::{ClosedForm, Detail, Integrator, Outcome, Problem, Scene, Stage, Taylor, critical_velocity};
//!
//! # let scene = Scene::from_toml(r#"
//! #     projectile = { mass = "2 kg", diameter = "50 mm", nose = { factor = 0.72 } }
//! #     target = { strength = "36 MPa", density = "2300 kg/m^3", thickness = "180 mm" }
//! #     resistance = { S = 12.0, B = 1.0, k = 2.0 }
//! # "#, "slab.toml")?;
//! let found = critical_velocity(&scene, &Taylor::default())?;
//! assert_eq!(format!("{:.9} m/s", found.velocity), "364.024037757 m/s");
//! assert!(found.error_bar.is_some_and(|bound| bound < 1e-11));
//!
//! // 2 kg at 300 m/s against a constant force of 1 MN: M V0²/(2 P) = 0.09 m.
//! let block = Problem::of_stages(2.0, 300.0, [Stage::tunnel(1.0e6, 0.0)]);
//! let rest = ClosedForm.solve(&block, Detail::End)?;
//! assert_eq!((rest.outcome, rest.end.depth), (Outcome::Stopped, 0.09));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Order of your own results**: steps and errors in, order with its 95 % interval out, and a verdict on the formal order.
//!
//! ```
//! use penetrode::{StepError, fit_order};
//!
//! // dy/dt = -y from 1 to t = 1 by the midpoint rule.
//! let points = [20, 33, 55, 90, 148, 245].map(|steps| {
//!     let h = 1.0 / f64::from(steps);
//!     let y = (1.0 - h + 0.5 * h * h).powi(steps);
//!     StepError::new(h, y / (-1.0_f64).exp() - 1.0)
//! });
//! let fit = fit_order(&points)?;
//! assert_eq!(format!("{:.1}", fit.line.ok_or("no line")?.order), "2.0");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/` has more: `solve`, `order_study` of a scheme of your own, `own_integrator`, and `own_law`.
//!
//! # Which part answers what
//!
//! | question | answer |
//! |---|---|
//! | Where does it stop, how fast does it leave? | [`Integrator::solve`] of [`Taylor`], the default choice: round-off, and an error bound of the exit margin |
//! | Is there an exact answer? | [`ClosedForm`]; in 50 digits [`physics::reference`] |
//! | What does the paper's scheme give? | [`CentralDifference`] |
//! | Another general solver? | [`Diffsol`] (feature `diffsol`), [`Energy`] over depth; by name [`integrators::Method`] |
//! | My force F(x, V)? | as text in a scene ([`physics::expression`]), in code by [`physics::ForceFunction`] |
//! | Which velocity perforates? | [`critical_velocity`](fn@critical_velocity); exactly [`studies::critical_velocity::exact`] |
//! | Which order does my scheme have? | [`fit_order`]; from a table of results [`studies::audit`](mod@studies::audit) |
//! | How does one of ours converge? | [`studies::convergence`] |
//! | Along a parameter, over many scenes? | [`studies::sweep`], [`studies::batch`] |
//! | By how much does an input matter? | [`studies::sensitivity`] |
//! | Does another program agree? | [`exchange::peers`] |
//! | What is wrong with a solver? | [`studies::diagnosis`](mod@studies::diagnosis) |
//!
//! # Errors
//!
//! An outcome is no error: rest, perforation and `Undecided`, where the error bound of the method leaves the outcome open,
//! are values of [`Outcome`]. Errors are a [`SceneError`] that points into the file, a [`physics::ResolveError`] of its
//! numbers, an [`IntegrationError`] of the computation. Each says what to do about it: [`Advice`].
//!
//! # Limits
//!
//! One rigid projectile, normal impact, motion along a line, resistance without memory. Closed forms
//! are those of `p + s x + r V + q V²` in a stage. Units are SI inside; 64-bit numbers, with dual numbers and double-double where [`physics::Scalar`] stands.
//!
//! # Features
//!
//! | feature | brings | default |
//! |---|---|---|
//! | `cli` | the program `penetrode`, and `report` | yes |
//! | `report` | the verification suite, the bench, pages, figures, JSON schemas | with `cli` |
//! | `diffsol` | the methods tsit45, bdf, esdirk34, tr-bdf2 and adaptive: nearly all of the build time | yes |
//! | `parquet` | tables in Parquet beside CSV | no |
//!
//! The library alone: `penetrode = { version = "0.1", default-features = false }`.

#[cfg(feature = "cli")]
pub mod cli;
pub mod exchange;
pub mod integrators;
pub mod physics;
#[cfg(feature = "report")]
pub mod report;
pub mod studies;
#[cfg(feature = "report")]
pub mod suite;
#[cfg(test)]
mod testing;
pub mod text;

pub use exchange::SceneError;
#[cfg(feature = "diffsol")]
pub use integrators::Diffsol;
pub use integrators::{CentralDifference, ClosedForm, Detail, Energy, Flight, IntegrationError, Integrator, Taylor};
pub use physics::{Advice, Outcome, Problem, Scene, Stage, State};
pub use studies::critical_velocity::of_scene as critical_velocity;
pub use studies::order::{StepError, fit as fit_order};
