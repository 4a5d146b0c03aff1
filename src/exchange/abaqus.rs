//! A problem as what Abaqus/Explicit runs: the user subroutine `VDLOAD`, input decks, and a driver that calls the
//! subroutine as Abaqus does.
//!
//! `VDLOAD` is handed coordinates and velocity of the face and returns the pressure on it. Explicit codes hand over the
//! velocity of the half step, so the scheme is [`CentralDifference`](crate::integrators::CentralDifference) with
//! [`VelocityAt::LaggedHalfStep`](crate::integrators::VelocityAt::LaggedHalfStep), and first order where the force depends
//! on the velocity.
//!
//! Source: Abaqus User Subroutines Reference Manual, `VDLOAD`; Abaqus Keywords Reference, `*DSLOAD` (type PNU), `*RIGID BODY`,
//! `*DYNAMIC`; Elements, "Rigid element library" (RAX2).

use std::f64::consts::PI;
use std::fmt::Write as _;

use thiserror::Error;

use crate::physics::{Advice, Problem, Stage};

/// Why a problem has no `VDLOAD`.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ExportError {
    /// A law of its own, or an end that is no depth.
    #[error(
        "stage {0} has an expression for its force or its end, and the subroutine is written of coefficients and depths"
    )]
    Law(usize),
    /// Nothing to run.
    #[error("the impact velocity is 0: there is nothing to run")]
    AtRest,
}

impl Advice for ExportError {
    fn is_usage(&self) -> bool {
        true
    }

    fn help(&self) -> String {
        match self {
            Self::Law(_) => {
                "give the stage `static_force`, `stiffness`, `viscosity` and `drag`, or a table of the force"
            }
            Self::AtRest => "give the scene an impact velocity",
        }
        .to_owned()
    }
}

/// What is exported.
#[derive(Clone, Debug)]
pub struct Export<'a> {
    /// Title for people.
    pub title: &'a str,
    /// The equation of motion at the impact velocity of the scene.
    pub problem: &'a Problem,
    /// Area of the face (m²).
    pub area: f64,
    /// Fixed time increment, and the largest one of the deck with automatic ones (s).
    pub time_step: f64,
    /// Time to be run (s).
    pub duration: f64,
}

/// Longest line of a text in fixed form, behind its mark.
const TITLE_MAX: usize = 60;

impl Export<'_> {
    /// The files by name: `vdload.f`, `fixed.inp`, `automatic.inp`, and, to be run without Abaqus, `driver.f` with
    /// `double/vaba_param.inc` and `single/vaba_param.inc`.
    ///
    /// # Errors
    /// [`ExportError`].
    pub fn files(&self) -> Result<Vec<(String, String)>, ExportError> {
        let problem = self.problem;
        if let Some(stage) = (0..problem.stages.len()).find(|&stage| problem.laws.of(stage).is_some()) {
            return Err(ExportError::Law(stage));
        }
        if problem.impact_speed == 0.0 {
            return Err(ExportError::AtRest);
        }
        let deck = |step: &str| self.fill(include_str!("abaqus/deck.inp")).replace("@STEP@", step);
        let (dt, end) = (self.time_step, self.duration);
        let fixed = format!("*Dynamic, Explicit, direct user control\n{dt:e}, {end:e}");
        let automatic = format!(
            "** Nothing here deforms: the fourth number alone bounds the increment.\n*Dynamic, Explicit\n, {end:e}, , {dt:e}"
        );
        let files = [
            ("vdload.f", self.fill(include_str!("abaqus/vdload.f"))),
            ("fixed.inp", deck(&fixed)),
            ("automatic.inp", deck(&automatic)),
            ("driver.f", self.fill(include_str!("abaqus/driver.f"))),
            ("double/vaba_param.inc", include_str!("abaqus/double.inc").to_owned()),
            ("single/vaba_param.inc", include_str!("abaqus/single.inc").to_owned()),
        ];
        Ok(files.map(|(name, text)| (name.to_owned(), text)).into())
    }

    /// `template` with the numbers of the problem in place of its words.
    fn fill(&self, template: &str) -> String {
        let problem = self.problem;
        let title: String = crate::text::one_line(self.title).chars().filter(char::is_ascii).take(TITLE_MAX).collect();
        let radius = (self.area / PI).sqrt();
        let (exit, place) = if problem.has_exit() {
            ("Behind\nc     the far side it goes on: there, read the history.", "that of the far side")
        } else {
            ("There is\nc     no far side.", "1e30")
        };
        let has_exit = |depth: f64| if depth.is_finite() { depth } else { 1e30 };
        let exponent = |value: f64| format!("{value:e}");
        let number = |text: &str, value: f64| {
            // A deck has plain exponents, Fortran those of double precision.
            if text.starts_with('*') { format!("{value:e}") } else { fortran(value) }
        };
        let words = [
            ("@TITLE@", title),
            ("@VERSION@", env!("CARGO_PKG_VERSION").to_owned()),
            ("@VELOCITY@", exponent(problem.impact_speed)),
            ("@EXIT@", exit.to_owned()),
            ("@WHERE@", place.to_owned()),
            ("@STAGES@", problem.stages.len().to_string()),
            ("@DATA@", self.data()),
            ("@DT@", exponent(self.time_step)),
            ("@XEXIT@", fortran(has_exit(problem.exit_depth))),
            ("@AREA@", number(template, self.area)),
            ("@MASS@", number(template, problem.mass)),
            ("@V0@", number(template, problem.impact_speed)),
            ("@RADIUS@", exponent(radius)),
            ("@TAIL@", exponent(-4.0 * radius)),
            ("@MIDDLE@", exponent(-2.0 * radius)),
        ];
        words.iter().fold(template.to_owned(), |text, (word, value)| text.replace(word, value))
    }

    /// The coefficients, a line each.
    fn data(&self) -> String {
        let mut data = format!("      data area / {} /", fortran(self.area));
        for (index, stage) in self.problem.stages.iter().enumerate() {
            let Stage { static_force, stiffness, viscosity, drag, end } = *stage;
            let end = if end.is_finite() { end } else { 1e30 };
            for (name, value) in
                [("fp", static_force), ("fs", stiffness), ("fr", viscosity), ("fq", drag), ("send", end)]
            {
                // Writing to a String cannot fail.
                let _ = write!(data, "\n      data {name}({}) / {} /", index + 1, fortran(value));
            }
        }
        data
    }
}

/// A constant of double precision that reads back to the same number; where reals are single, it is rounded to them.
fn fortran(value: f64) -> String {
    format!("{value:e}").replace('e', "d")
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing text is a failed test")]
mod tests {
    use super::*;
    use crate::testing::shipped;

    fn text(scene: &str, file: &str) -> String {
        let problem = shipped(scene).problem().unwrap();
        let export = Export {
            title: "a title\nwith µ and a second line that goes on and on and on and on and on",
            problem: &problem,
            area: 0.25 * PI * 0.05 * 0.05,
            time_step: 1e-6,
            duration: 2e-3,
        };
        export.files().unwrap().into_iter().find(|(name, _)| name == file).unwrap().1
    }

    #[test]
    fn no_word_of_a_template_is_left_and_every_line_of_fortran_fits_in_fixed_form() {
        for scene in ["tunnel", "perforate", "layered", "softening", "stiff"] {
            for (file, is_fixed_form) in
                [("vdload.f", true), ("driver.f", true), ("fixed.inp", false), ("automatic.inp", false)]
            {
                let text = text(scene, file);
                assert!(!text.contains('@') && text.is_ascii(), "{scene} {file}: {text}");
                assert!(!is_fixed_form || text.lines().all(|line| line.len() <= 72), "{scene} {file}: {text}");
            }
        }
    }

    #[test]
    fn constants_read_back_to_the_same_number_and_an_open_end_is_far_away() {
        for value in [0.1, 1.0 / 3.0, 5e-324, 8.48e5, -10.0, 0.0] {
            assert_eq!(fortran(value).replace('d', "e").parse::<f64>(), Ok(value));
        }
        let vdload = text("tunnel", "vdload.f");
        assert!(vdload.contains("data send(2) / 1d30 /") && vdload.contains("nstage = 2"), "{vdload}");
    }

    #[test]
    fn a_law_of_its_own_and_a_projectile_at_rest_are_refused() {
        let refuse = |problem: &Problem| {
            Export { title: "", problem, area: 1.0, time_step: 1e-6, duration: 1.0 }.files().unwrap_err()
        };
        assert_eq!(refuse(&shipped("law-power").problem().unwrap()), ExportError::Law(0));
        assert_eq!(refuse(&shipped("tunnel").resolve(0.0).unwrap()), ExportError::AtRest);
    }
}
