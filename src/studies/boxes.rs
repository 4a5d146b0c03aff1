//! What may every answer be, if numbers of the scene lie anywhere between two values? Proved (docs/enclosures.md, section 7).
//!
//! Where the sign of an answer's derivative is proved over the whole box, its range is that of two corners. Where it is not,
//! the box is cut, and each piece is one flight whose numbers are as wide as the piece.

use std::str::FromStr;

use thiserror::Error;

use super::enclosure::{self, Interval, Intervals};
use super::error::Studied;
use crate::integrators::{Detail, Flight};
use crate::physics::ball::Ball;
use crate::physics::decimals::Written;
use crate::physics::expression::Unit;
use crate::physics::parameter::{LayerNumber, Parameter, ParameterError, StageNumber};
use crate::physics::{Advice, CraterStiffness, Criterion, Outcome, Resistance, Scalar, Scene, State};

/// Pieces along each number whose sign is not proved, by how many there are.
const PIECES: [usize; 4] = [1, 256, 24, 8];

/// A number of a scene, and between which two values it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// The number.
    pub parameter: Parameter,
    /// The least value (SI); it means its shortest decimal.
    pub low: f64,
    /// The greatest.
    pub high: f64,
    /// The unit that both are written in, where the number is a parameter of a law.
    pub unit: Option<Unit>,
}

/// Why there is no such box. All are mistakes of the caller, exit code 2.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum BoxError {
    /// Not `PATH=A:B`.
    #[error("`{0}` is not of the form PATH=A:B")]
    Form(String),
    /// A parameter or a value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A group, which moves another number.
    #[error("`{0}` is a group of numbers, and a box is of numbers of the scene")]
    Group(Parameter),
    /// The greatest value lies below the least.
    #[error("`{0}` falls: the least value comes first")]
    Falls(String),
    /// A number twice.
    #[error("`{0}` has two sides")]
    Twice(Parameter),
    /// More numbers without a proved sign than are cut.
    #[error("of {0}, the sign of no derivative is proved, and at most three such numbers are cut into pieces")]
    TooMany(String),
}

impl Advice for BoxError {
    fn help(&self) -> String {
        match self {
            Self::Parameter(error) => error.help(),
            Self::Group(parameter) => format!("give `{}` in its place", parameter.moves()),
            Self::TooMany(_) => "leave one of them at its value".to_owned(),
            _ => "write for example target.strength=34MPa:38MPa".to_owned(),
        }
    }
}

impl FromStr for Side {
    type Err = BoxError;

    fn from_str(text: &str) -> Result<Self, BoxError> {
        let form = || BoxError::Form(text.to_owned());
        let (path, range) = text.split_once('=').ok_or_else(form)?;
        let (from, to) = range.split_once(':').ok_or_else(form)?;
        let parameter: Parameter = path.trim().parse()?;
        if parameter.moves() != parameter {
            return Err(BoxError::Group(parameter));
        }
        let ([low, high], unit) = parameter.parse_ends([from, to])?;
        if high < low { Err(BoxError::Falls(text.to_owned())) } else { Ok(Self { parameter, low, high, unit }) }
    }
}

/// What may become of the projectile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcomes {
    /// This, at every point of the box.
    One(Outcome),
    /// It stops at some points, and perforates at others.
    Either,
}

/// What is proved of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranges {
    /// What becomes of the projectile.
    pub outcomes: Outcomes,
    /// Depth, time and velocity at the end; no upper end where none is proved.
    pub end: Intervals,
}

/// A scene, what was written for it, and the sides of a box.
#[derive(Clone, Debug)]
pub struct Region<'a> {
    scene: &'a Scene,
    written: &'a Written,
    sides: Vec<Side>,
}

/// Which end of a side makes an answer least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rises {
    /// The answer rises with the number.
    Yes,
    /// It falls.
    No,
}

/// What is asked at the corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    /// W at each depth, and what follows from it: velocity at the exit, outcome.
    Energy,
    /// Depth of the end: it grows with the thickness too.
    Depth,
    /// Time of the exit: it falls with W, and grows with the thickness.
    Time,
}

impl<'a> Region<'a> {
    /// The box of `sides` around `scene`.
    ///
    /// # Errors
    /// [`BoxError`].
    pub fn new(scene: &'a Scene, written: &'a Written, sides: &[Side]) -> Result<Self, BoxError> {
        let mut probe = scene.clone();
        for (index, side) in sides.iter().enumerate() {
            if sides[..index].iter().any(|other| other.parameter == side.parameter) {
                return Err(BoxError::Twice(side.parameter));
            }
            side.parameter.admit_unit(&probe, side.unit)?;
            side.parameter.set(&mut probe, side.low)?;
            side.parameter.set(&mut probe, side.high)?;
        }
        let found = Self { scene, written, sides: sides.to_vec() };
        let open: Vec<_> = found.open(found.slowest_speed()).map(|side| side.parameter.to_string()).collect();
        if open.len() < PIECES.len() { Ok(found) } else { Err(BoxError::TooMany(open.join(", "))) }
    }

    fn side(&self, parameter: Parameter) -> Option<&Side> {
        self.sides.iter().find(|side| side.parameter == parameter)
    }

    fn slowest_speed(&self) -> f64 {
        self.side(Parameter::Velocity).map_or(self.scene.velocity.unwrap_or(0.0), |side| side.low)
    }

    /// Sides of which no sign is proved, at impact speeds from `slowest` (m/s) on.
    fn open(&self, slowest: f64) -> impl Iterator<Item = &Side> {
        let drag_rises = self.drag_only_slows(slowest);
        self.sides.iter().filter(move |side| self.energy_rises(side.parameter, drag_rises).is_none())
    }

    /// Whether W at every depth rises with the number; `None` where that is not proved.
    fn energy_rises(&self, parameter: Parameter, drag_only_slows: bool) -> Option<Rises> {
        use LayerNumber as L;
        use Parameter as P;
        use StageNumber as S;
        // More force may bring a condition forward, and the flight behind it may then get farther.
        if self.scene.has_conditions() {
            return None;
        }
        match parameter {
            P::Velocity => Some(Rises::Yes),
            P::Mass if self.resists() => Some(Rises::Yes),
            P::Thickness if self.resists() => Some(Rises::No),
            P::Strength
            | P::StaticFactor
            | P::CraterStiffness
            | P::Layer(_, L::Strength | L::StaticFactor | L::Viscosity)
            | P::Stage(_, S::StaticForce | S::Stiffness | S::Viscosity | S::Drag) => Some(Rises::No),
            P::Density | P::NoseFactor | P::InertiaFactor | P::Layer(_, L::Density) if drag_only_slows => {
                Some(Rises::No)
            }
            _ => None,
        }
    }

    /// Whether no stage drives the projectile, whatever the numbers of the box.
    fn resists(&self) -> bool {
        match &self.scene.resistance {
            Resistance::Concrete(_) => true,
            Resistance::Stages(stages) => {
                // A table may drive.
                let is_changed = !self.scene.forces.is_empty()
                    || self.sides.iter().any(|side| matches!(side.parameter, Parameter::Stage(..)));
                !is_changed && stages.iter().all(crate::physics::Stage::resists)
            }
        }
    }

    /// Whether more drag is more force at each depth and speed: always where c is given; where the crater is continuous,
    /// c rises with Q if `M V0² >= k d P`.
    fn drag_only_slows(&self, slowest: f64) -> bool {
        let Some(concrete) = self.scene.concrete() else { return true };
        let has_no_crater = concrete.crater_ratio == 0.0 && self.side(Parameter::CraterRatio).is_none();
        if has_no_crater || concrete.crater_stiffness != CraterStiffness::Continuous {
            return true;
        }
        let highest = |side: &Side| {
            let is_least = matches!(side.parameter, Parameter::Mass);
            (side.parameter, if is_least { side.low } else { side.high })
        };
        let corner = self.sides.iter().filter(|side| side.parameter != Parameter::Velocity).map(highest);
        let Some(scene) = self.at(corner) else { return false };
        // Below the decimal that a speed is written as.
        let speed = Ball::from_f64(slowest.next_down().max(0.0));
        let Ok(problem) = scene.enclosed(&self.unwritten(), Some(speed)) else { return false };
        let (depth, beyond) = problem.crater_depth_and_tunnel();
        (problem.mass * speed * speed - depth * beyond.static_force).lower() >= 0.0
    }

    /// What was written, but for the sides: their values are shortest decimals.
    fn unwritten(&self) -> Written {
        let mut written = self.written.clone();
        written.numbers.retain(|(parameter, _)| self.side(*parameter).is_none());
        if self.side(Parameter::NoseFactor).is_some() {
            written.nose = None;
        }
        written
    }

    /// The scene with these numbers.
    fn at(&self, numbers: impl IntoIterator<Item = (Parameter, f64)>) -> Option<Scene> {
        let mut numbers: Vec<_> = numbers.into_iter().collect();
        numbers.sort_by_key(|(parameter, _)| *parameter);
        let mut scene = self.scene.clone();
        for (parameter, value) in numbers {
            parameter.set(&mut scene, value).ok()?;
        }
        Some(scene)
    }

    /// The corner at which the answer is least, or greatest, of the sides whose sign is proved, for one piece of the others.
    fn corner(
        &self,
        asked: Asked,
        is_least: bool,
        drag_only_slows: bool,
        piece: &[(Parameter, f64, f64)],
    ) -> Option<(Scene, Written)> {
        let number = |side: &Side| {
            let rises = self.energy_rises(side.parameter, drag_only_slows)? == Rises::Yes;
            let rises = match (asked, side.parameter) {
                (Asked::Depth | Asked::Time, Parameter::Thickness) => true,
                (Asked::Time, _) => !rises,
                _ => rises,
            };
            Some((side.parameter, if rises == is_least { side.low } else { side.high }))
        };
        let middles = piece.iter().map(|(parameter, low, high)| (*parameter, low + 0.5 * (high - low)));
        let scene = self.at(self.sides.iter().filter_map(number).chain(middles))?;
        let range =
            |&(parameter, low, high): &(Parameter, f64, f64)| (parameter, Ball::decimal(low).hull(Ball::decimal(high)));
        Some((scene, Written { ranges: piece.iter().map(range).collect(), ..self.unwritten() }))
    }

    /// The pieces of the `open` sides.
    fn pieces(open: &[Side]) -> Vec<Vec<(Parameter, f64, f64)>> {
        let count = PIECES.get(open.len()).copied().unwrap_or(1);
        let mut pieces = vec![Vec::new()];
        for side in open {
            let cut = |i: usize| {
                if i == count { side.high } else { side.low + (side.high - side.low) * (i as f64 / count as f64) }
            };
            let longer = |piece: &Vec<(Parameter, f64, f64)>| {
                let piece = piece.clone();
                (0..count)
                    .map(move |i| {
                        let mut longer = piece.clone();
                        longer.push((side.parameter, cut(i), cut(i + 1)));
                        longer
                    })
                    .collect::<Vec<_>>()
            };
            pieces = pieces.iter().flat_map(longer).collect();
        }
        pieces
    }

    /// Whether widths of depths are refused: which layer or branch comes first is then no one answer.
    fn is_unsuited(&self, open: &[Side]) -> bool {
        let moves_depths = open.iter().any(|side| {
            matches!(
                side.parameter,
                Parameter::Diameter | Parameter::CraterRatio | Parameter::Layer(_, LayerNumber::Thickness)
            )
        });
        let has_layers = self.scene.concrete().is_some_and(|concrete| !concrete.layers.is_empty());
        // Which rows of a table a stage has is no one answer where its end is none.
        let cuts_tables = open.iter().any(|side| matches!(side.parameter, Parameter::Stage(_, StageNumber::End)))
            && !self.scene.forces.is_empty();
        cuts_tables || (moves_depths && (has_layers || self.scene.criterion != Criterion::FullDepth))
    }

    /// What becomes of the projectile anywhere in the box.
    ///
    /// `None` without a proof.
    ///
    /// # Errors
    /// As [`Scene::resolve`].
    pub fn flight(&self) -> Studied<Option<Ranges>> {
        let slows = self.drag_only_slows(self.slowest_speed());
        let open: Vec<Side> = self.open(self.slowest_speed()).copied().collect();
        if self.is_unsuited(&open) {
            return Ok(None);
        }
        let mut whole: Option<Ranges> = None;
        for piece in Self::pieces(&open) {
            let solved = |asked, is_least| -> Studied<Option<Flight<Ball>>> {
                let Some((scene, written)) = self.corner(asked, is_least, slows, &piece) else { return Ok(None) };
                // A piece that is refused, or a corner without an end, leaves the box without a proof.
                let flight = enclosure::flight(&scene, &written, Detail::End)?.ok();
                Ok(flight.filter(|flight| flight.outcome != Outcome::Undecided))
            };
            let (Some(slow), Some(fast)) = (solved(Asked::Energy, true)?, solved(Asked::Energy, false)?) else {
                return Ok(None);
            };
            let (Some(near), Some(far)) = (solved(Asked::Depth, true)?, solved(Asked::Depth, false)?) else {
                return Ok(None);
            };
            let stops = [&slow, &fast].map(|flight| flight.outcome.is_stop());
            let outcomes = match stops {
                [true, false] => Outcomes::Either,
                _ if slow.outcome == fast.outcome => Outcomes::One(slow.outcome),
                _ => Outcomes::One(Outcome::Stopped),
            };
            let time = if stops == [false, false] {
                match (solved(Asked::Time, true)?, solved(Asked::Time, false)?) {
                    (Some(early), Some(late)) => hull(early.end.time, late.end.time),
                    _ => (Some(0.0), None),
                }
            } else {
                (Some(0.0), None)
            };
            let end = Intervals {
                depth_m: hull(near.end.depth, far.end.depth),
                time_s: time,
                velocity_m_s: hull(slow.end.velocity, fast.end.velocity),
            };
            let of_piece = Ranges { outcomes, end };
            whole = Some(whole.map_or(of_piece, |whole| whole.and(of_piece)));
        }
        let Some(mut whole) = whole else { return Ok(None) };
        if whole.end.time_s.1.is_none() && whole.outcomes != Outcomes::Either {
            whole.end.time_s = self.time_in_pieces();
        }
        Ok(Some(whole))
    }

    /// The time of the end, of which no sign is proved at rest: by pieces of all sides.
    fn time_in_pieces(&self) -> Interval {
        let unknown = (Some(0.0), None);
        if self.sides.len() >= PIECES.len() || self.is_unsuited(&self.sides) {
            return unknown;
        }
        let mut whole: Option<(Option<f64>, Option<f64>)> = None;
        for piece in Self::pieces(&self.sides) {
            let middles = piece.iter().map(|(parameter, low, high)| (*parameter, low + 0.5 * (high - low)));
            let Some(scene) = self.at(middles) else { return unknown };
            let ranges =
                piece.iter().map(|&(parameter, low, high)| (parameter, Ball::decimal(low).hull(Ball::decimal(high))));
            let written = Written { ranges: ranges.collect(), ..self.unwritten() };
            let Ok(Ok(flight)) = enclosure::flight(&scene, &written, Detail::End) else { return unknown };
            if flight.outcome == Outcome::Undecided {
                return unknown;
            }
            let time = hull(flight.end.time, flight.end.time);
            whole = Some(whole.map_or(time, |whole| join(whole, time)));
        }
        whole.unwrap_or(unknown)
    }

    /// The critical velocity anywhere in the box (m/s): nothing perforates below the least, everything above the greatest.
    ///
    /// `None` without a proof.
    pub fn critical(&self) -> Option<(f64, f64)> {
        // With the least V_c a sign that depends on the speed holds for all others.
        let guess = |slows: bool, is_least: bool, piece: &[(Parameter, f64, f64)]| {
            let (scene, written) = self.corner(Asked::Energy, !is_least, slows, piece)?;
            enclosure::critical(&scene, &written)
        };
        let of = |slows: bool| {
            let open: Vec<Side> =
                self.sides.iter().filter(|side| self.energy_rises(side.parameter, slows).is_none()).copied().collect();
            if open.len() >= PIECES.len() || self.is_unsuited(&open) {
                return None;
            }
            let mut whole: Option<(f64, f64)> = None;
            for piece in Self::pieces(&open) {
                let (low, high) = (guess(slows, true, &piece)?.0, guess(slows, false, &piece)?.1);
                whole = Some(whole.map_or((low, high), |(a, b)| (a.min(low), b.max(high))));
            }
            whole
        };
        match of(true) {
            Some((low, high)) if self.drag_only_slows(low) => Some((low, high)),
            _ => of(false),
        }
    }
}

/// From the least of one ball to the greatest of another.
fn hull(a: Ball, b: Ball) -> Interval {
    let of = |ball: Ball| {
        let state = State { time: ball, depth: ball, velocity: ball };
        Intervals::of(&state).depth_m
    };
    join(of(a), of(b))
}

/// Both intervals and what lies between.
fn join(a: Interval, b: Interval) -> Interval {
    let low = a.0.zip(b.0).map(|(a, b)| a.min(b));
    (low, a.1.zip(b.1).map(|(a, b)| a.max(b)))
}

impl Ranges {
    /// What is proved of two pieces.
    fn and(self, other: Self) -> Self {
        let is_stop = |outcomes: Outcomes| match outcomes {
            Outcomes::One(outcome) => Some(outcome.is_stop()),
            Outcomes::Either => None,
        };
        let outcomes = match (self.outcomes, other.outcomes) {
            (a, b) if a == b => a,
            (a, b) if is_stop(a) == Some(true) && is_stop(b) == Some(true) => Outcomes::One(Outcome::Stopped),
            _ => Outcomes::Either,
        };
        let end = Intervals {
            depth_m: join(self.end.depth_m, other.end.depth_m),
            time_s: join(self.end.time_s, other.end.time_s),
            velocity_m_s: join(self.end.velocity_m_s, other.end.velocity_m_s),
        };
        Self { outcomes, end }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::exchange::scene_file::SceneFile;
    use crate::integrators::{Integrator, Taylor};
    use crate::testing::Random;

    fn file(name: &str) -> SceneFile {
        SceneFile::read(std::path::Path::new(name), &[]).unwrap()
    }

    fn sides(texts: &[&str]) -> Vec<Side> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    }

    /// Random points of the box lie in its ranges, and come near both ends of those of depth and velocity.
    #[test]
    fn every_point_of_a_box_lies_in_its_ranges() {
        for (name, texts, is_sharp) in [
            ("tunnel", &["target.strength=30MPa:40MPa"][..], true),
            ("tunnel", &["impact.velocity=280:320", "target.density=2200:2400"], true),
            ("perforate", &["target.strength=34MPa:38MPa", "projectile.mass=1.9:2.1", "impact.velocity=400:410"], true),
            ("paper-slab", &["target.thickness=0.25:0.3", "projectile.nose.factor=0.9:1"], true),
            ("perforate", &["projectile.diameter=0.0495:0.05"], false),
            ("graze", &["impact.velocity=390:410"], true),
        ] {
            let SceneFile { scene, written } = file(name);
            let of = Region::new(&scene, &written, &sides(texts)).unwrap();
            let ranges = of.flight().unwrap().unwrap();
            let random = &mut Random::new(3);
            let (mut least, mut greatest) = ([f64::INFINITY; 2], [0.0_f64; 2]);
            for _ in 0..400 {
                let share = |random: &mut Random| (1.4 * random.uniform(0.0, 1.0) - 0.2).clamp(0.0, 1.0);
                let numbers: Vec<_> =
                    of.sides.iter().map(|s| (s.parameter, s.low + share(random) * (s.high - s.low))).collect();
                let at = of.at(numbers).unwrap();
                let flight = Taylor::default().solve(&at.problem().unwrap(), Detail::End).unwrap();
                let end = [flight.end.depth, flight.end.velocity, flight.end.time];
                for (value, (low, high)) in
                    end.into_iter().zip([ranges.end.depth_m, ranges.end.velocity_m_s, ranges.end.time_s])
                {
                    let slack = 1e-13 * value;
                    assert!(low.unwrap() <= value + slack, "{name} {texts:?}: {value} below {low:?}");
                    assert!(high.is_none_or(|high| value <= high + slack), "{name} {texts:?}: {value} above {high:?}");
                }
                match ranges.outcomes {
                    Outcomes::One(Outcome::Perforated) => assert_eq!(flight.outcome, Outcome::Perforated),
                    Outcomes::One(_) => assert!(flight.outcome.is_stop()),
                    Outcomes::Either => {}
                }
                for i in 0..2 {
                    least[i] = least[i].min(end[i]);
                    greatest[i] = greatest[i].max(end[i]);
                }
            }
            if is_sharp {
                for (i, (low, high)) in [ranges.end.depth_m, ranges.end.velocity_m_s].into_iter().enumerate() {
                    let slack = 1e-12 * greatest[i];
                    assert!((least[i] - low.unwrap()).abs() <= slack, "{name} {texts:?}: {} {low:?}", least[i]);
                    assert!((greatest[i] - high.unwrap()).abs() <= slack, "{name} {texts:?}: {} {high:?}", greatest[i]);
                }
            }
        }
    }

    /// Driven and then braked: more thickness is less speed, and then more.
    #[test]
    fn a_thickness_has_no_sign_where_a_stage_drives() {
        let text = "projectile.mass = 2\nimpact.velocity = 100\ntarget.thickness = 0.2\n\
                    [[stage]]\nstatic_force = 20000\nend = 0.2\n[[stage]]\nstatic_force = -20000\n";
        let SceneFile { scene, written } = SceneFile::from_toml(text, "driven.toml", &[]).unwrap();
        let of = Region::new(&scene, &written, &sides(&["target.thickness=0.1:0.3"])).unwrap();
        // sqrt(100² - 2 · 20000 · 0.2/2) at H = 0.2 m.
        let least = of.flight().unwrap().map_or(0.0, |ranges| ranges.end.velocity_m_s.0.unwrap());
        assert!(least <= 77.459_666_924_148_34, "{least}");
    }

    /// 2 kg from 16 m/s to 12 m/s in 112/F, and driven by 64 N from there to 3 m: `V² = 144 + 64 (3 - 112/F)`, and `256 - 3 F` where
    /// F is too little for that. Least at F = 112/3.
    #[test]
    fn more_force_that_brings_a_condition_forward_may_leave_more_speed() {
        let text = "projectile.mass = 2\nimpact.velocity = 16\ntarget.thickness = 3\n[[stage]]\nstatic_force = 64\n\
                    end_velocity = 12\n[[stage]]\nstatic_force = -64\n";
        let SceneFile { scene, written } = SceneFile::from_toml(text, "forward.toml", &[]).unwrap();
        let of = |texts: &[&str]| Region::new(&scene, &written, &sides(texts)).unwrap().flight().unwrap();
        let (low, high) = of(&["stage.0.static_force=64:96"]).unwrap().end.velocity_m_s;
        for force in [64.0, 80.0, 96.0_f64] {
            let exact = (144.0 + 64.0 * (3.0 - 112.0 / force)).sqrt();
            assert!(low.unwrap() <= exact && exact <= high.unwrap(), "{force}: {exact} in {low:?} .. {high:?}");
        }
        let least = of(&["stage.0.static_force=20:96"]).map_or(0.0, |ranges| ranges.end.velocity_m_s.0.unwrap());
        assert!(least <= 12.0, "{least}");
        // Wide numbers of a condition leave its time open by as much.
        let ranges = of(&["stage.0.end_velocity=11.9:12"]).unwrap();
        let (low, high) = ranges.end.velocity_m_s;
        assert!((14.806..=219.22_f64.sqrt()).contains(&low.unwrap()), "{ranges:?}");
        assert!((224.0_f64.sqrt()..14.967).contains(&high.unwrap()), "{ranges:?}");
    }

    /// Two speeds of one range are two numbers: behind the one the projectile may be faster than the other, or slower.
    #[test]
    fn two_end_velocities_of_one_range_are_not_taken_for_one() {
        let text = "projectile.mass = 2\nimpact.velocity = 16\n[[stage]]\nstatic_force = 64\nend_velocity = 12\n\
                    [[stage]]\nstatic_force = 1e-4\nend_velocity = 12\n[[stage]]\nstatic_force = 1024\n";
        let SceneFile { scene, written } = SceneFile::from_toml(text, "two.toml", &[]).unwrap();
        let ranges = sides(&["stage.0.end_velocity=11.999:12", "stage.1.end_velocity=11.999:12"]);
        let ball = |side: &Side| (side.parameter, Ball::decimal(side.low).hull(Ball::decimal(side.high)));
        let wide = Written { ranges: ranges.iter().map(ball).collect(), ..written.clone() };
        let refused = enclosure::flight(&scene, &wide, Detail::End).unwrap().unwrap_err();
        assert!(refused.is_usage() && refused.to_string().contains("conditions differ"), "{refused}");
        assert!(enclosure::flight(&scene, &written, Detail::End).unwrap().is_ok());
    }

    #[test]
    fn below_the_least_critical_velocity_nothing_in_the_box_perforates() {
        let SceneFile { scene, written } = file("paper-slab");
        let of = Region::new(&scene, &written, &sides(&["target.strength=25MPa:35MPa", "target.density=2200:2500"]))
            .unwrap();
        let (low, high) = of.critical().unwrap();
        let corner = |strength: f64, density: f64| {
            let at = of.at([(Parameter::Strength, strength), (Parameter::Density, density)]).unwrap();
            super::super::critical_velocity::of_scene(&at, &Taylor::default()).unwrap().velocity
        };
        let (least, greatest) = (corner(25e6, 2200.0), corner(35e6, 2500.0));
        assert!((low / least - 1.0).abs() < 1e-14 && (high / greatest - 1.0).abs() < 1e-14, "{low} {high}");
    }

    #[test]
    fn a_box_that_is_none_is_refused() {
        let SceneFile { scene, written } = file("tunnel");
        for text in [
            "target.strength=34MPa:38",
            "target.strength",
            "target.strength=1",
            "H/d=1:2",
            "target.strength=3MPa:2MPa",
            "nothing=1:2",
        ] {
            assert!(text.parse::<Side>().is_err(), "{text}");
        }
        let twice = sides(&["projectile.mass=1:2", "projectile.mass=1:3"]);
        assert!(matches!(Region::new(&scene, &written, &twice), Err(BoxError::Twice(_))));
        let many = sides(&["projectile.diameter=0.05:0.06", "resistance.k=1:2"]);
        assert!(Region::new(&scene, &written, &many).is_ok());
    }
}
