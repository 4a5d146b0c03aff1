//! The problem of a scene whose numbers are the decimals that were written, and not the `f64` beside them: for enclosures.
//!
//! Products and sums of the scene (the depth k d, P, Q, c, Eq. 14, N* of a shape) are balls then, which hold what the decimals
//! make exactly. Depths that are equal as decimals, such as k d and H, are made the same ball; the order of others is that of
//! their values.

use super::ball::{Ball, TINY};
use super::nose::NoseShape;
use super::parameter::{LayerNumber, Parameter, StageNumber};
use super::problem::Problem;
use super::scalar::Scalar;
use super::scene::{Criterion, Force, Resistance, ResolveError, Resolved, Scene, layer_beyond};
use super::semi_empirical;
use super::units::{self, Quantity};

/// A decimal, exactly: `digits 10^exponent`.
#[derive(Clone, Copy, Debug)]
struct Decimal {
    digits: i128,
    exponent: i64,
}

impl Decimal {
    fn read(text: &str) -> Option<Self> {
        units::decimal(text).map(|(digits, exponent)| Self { digits, exponent })
    }

    fn times(self, other: Self) -> Option<Self> {
        let digits = self.digits.checked_mul(other.digits)?;
        Some(Self { digits, exponent: self.exponent.checked_add(other.exponent)? })
    }

    /// Both with the exponent of the smaller.
    fn aligned(self, other: Self) -> Option<(i128, i128, i64)> {
        let exponent = self.exponent.min(other.exponent);
        let raised = |one: Self| {
            let power = u32::try_from(one.exponent - exponent).ok()?;
            one.digits.checked_mul(10_i128.checked_pow(power)?)
        };
        Some((raised(self)?, raised(other)?, exponent))
    }

    fn plus(self, other: Self) -> Option<Self> {
        let (a, b, exponent) = self.aligned(other)?;
        Some(Self { digits: a.checked_add(b)?, exponent })
    }

    fn is_above(self, other: Self) -> Option<bool> {
        self.aligned(other).map(|(a, b, _)| a > b)
    }

    fn equals(self, other: Self) -> bool {
        self.aligned(other).is_some_and(|(a, b, _)| a == b)
    }
}

/// What was written for the numbers of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Written {
    /// The decimal of each number that was written, in the order read. What is missing, or differs from the scene, counts as
    /// the shortest decimal of its `f64`.
    pub numbers: Vec<(Parameter, Quantity)>,
    /// The shape of the nose and its ratios, psi and t, where the factor N* was not written itself.
    pub nose: Option<(NoseShape, Vec<Quantity>)>,
    /// Numbers that may be anywhere in a ball, in place of what was written.
    pub ranges: Vec<(Parameter, Ball)>,
}

impl Written {
    fn text(&self, parameter: Parameter, value: f64) -> Option<&Quantity> {
        let written = self.numbers.iter().rev().find(|(written, _)| *written == parameter);
        written.map(|(_, quantity)| quantity).filter(|quantity| quantity.value == value)
    }

    fn range(&self, parameter: Parameter) -> Option<Ball> {
        self.ranges.iter().find(|(ranged, _)| *ranged == parameter).map(|(_, ball)| *ball)
    }

    fn decimal(&self, parameter: Parameter, value: f64) -> Option<Decimal> {
        if self.range(parameter).is_some() {
            return None;
        }
        match self.text(parameter, value) {
            Some(quantity) => Decimal::read(&quantity.decimal).filter(|_| quantity.relative_error == 0.0),
            None => Decimal::read(&format!("{value:e}")),
        }
    }

    fn number(&self, parameter: Parameter, value: f64) -> Ball {
        if let Some(range) = self.range(parameter) {
            return range;
        }
        self.text(parameter, value).map_or_else(|| Ball::decimal(value), ball_of)
    }
}

/// What was written, as a ball; the SI value of some units is no decimal.
fn ball_of(quantity: &Quantity) -> Ball {
    let decimal = units::decimal(&quantity.decimal).map(|(digits, exponent)| Ball::of_decimal(digits, exponent));
    match decimal {
        Some(exact) if quantity.relative_error == 0.0 => exact,
        _ => {
            let error = quantity.relative_error + 2.0 * f64::EPSILON;
            Ball::from_f64(quantity.value).widened(error * quantity.value.abs())
        }
    }
}

impl Scene {
    /// The equation of motion of the decimals that were `written`, at the impact speed `speed`, or at the scene's own.
    ///
    /// # Errors
    /// As [`Scene::resolve`].
    pub fn enclosed(&self, written: &Written, speed: Option<Ball>) -> Resolved<Problem<Ball>> {
        let impact_speed = match speed {
            Some(speed) => speed.value(),
            None => self.velocity.ok_or(ResolveError::NoImpactSpeed)?,
        };
        let number = |parameter: Parameter, value: f64| match (parameter, &written.nose) {
            (Parameter::Velocity, _) => speed.unwrap_or_else(|| written.number(parameter, value)),
            (Parameter::Thickness, _) => self.total_thickness(written, value),
            (Parameter::NoseFactor, Some((shape, ratios)))
                if shape.factor() == value && written.range(parameter).is_none() =>
            {
                shape.factor_in([0, 1].map(|index| ratios.get(index).map_or_else(|| Ball::from_f64(0.0), ball_of)))
            }
            (Parameter::StaticFactor | Parameter::Layer(_, LayerNumber::StaticFactor), _) => {
                self.static_factor_of(written, parameter, value)
            }
            _ => written.number(parameter, value),
        };
        let mut problem = self.resolve_in(impact_speed, number)?;
        self.check_choices(written)?;
        self.unite_depths(written, &mut problem);
        Ok(problem)
    }

    /// Which layer lies behind k d, and which branch of the NDRC relation holds, is chosen by `f64`: the decimals must choose
    /// the same.
    fn check_choices(&self, written: &Written) -> Resolved<()> {
        let Some(concrete) = self.concrete() else { return Ok(()) };
        let number = |parameter, value| written.decimal(parameter, value);
        if !concrete.layers.is_empty() && concrete.crater_ratio != 0.0 {
            let crater = number(Parameter::CraterRatio, concrete.crater_ratio)
                .zip(number(Parameter::Diameter, concrete.diameter))
                .and_then(|(ratio, diameter)| ratio.times(diameter));
            let mut sum = Some(Decimal { digits: 0, exponent: 0 });
            let mut end = 0.0;
            for (index, layer) in concrete.layers.iter().enumerate().take(concrete.layers.len() - 1) {
                let thickness = number(Parameter::Layer(index, LayerNumber::Thickness), layer.thickness);
                sum = sum.zip(thickness).and_then(|(sum, thickness)| sum.plus(thickness));
                end += layer.thickness;
                let is_behind = sum.zip(crater).and_then(|(sum, crater)| sum.is_above(crater));
                let depth = concrete.crater_depth();
                let is_decided = match is_behind {
                    Some(is_behind) => is_behind == (end > depth),
                    // Without the decimals, what no rounding changes.
                    None => (end - depth).abs() > 1e-6 * depth,
                };
                if !is_decided {
                    return Err(ResolveError::ChosenByRounding("the end of a layer and the crater depth k d"));
                }
            }
        }
        if let (Criterion::Ndrc, Some(thickness)) = (self.criterion, self.thickness) {
            let ratio = thickness / concrete.diameter;
            let is_far = (ratio / semi_empirical::NDRC_FIRST_BRANCH_END - 1.0).abs() > 1e-6;
            if !is_far || written.range(Parameter::Thickness).or(written.range(Parameter::Diameter)).is_some() {
                let wide =
                    self.total_thickness(written, thickness) / written.number(Parameter::Diameter, concrete.diameter);
                let beyond = wide - Ball::decimal(semi_empirical::NDRC_FIRST_BRANCH_END);
                if !(beyond.lower() > 0.0 || beyond.upper() < 0.0)
                    || (beyond.value() <= 0.0) != (ratio <= semi_empirical::NDRC_FIRST_BRANCH_END)
                {
                    return Err(ResolveError::ChosenByRounding(
                        "H/d and the end of the first branch of the NDRC relation",
                    ));
                }
            }
        }
        Ok(())
    }

    /// H, with layers the sum of theirs.
    fn total_thickness(&self, written: &Written, value: f64) -> Ball {
        let layers = self.concrete().map_or(&[][..], |concrete| &concrete.layers);
        let of = |(index, layer): (usize, &super::scene::Layer)| {
            written.number(Parameter::Layer(index, LayerNumber::Thickness), layer.thickness)
        };
        if layers.is_empty() {
            return written.number(Parameter::Thickness, value);
        }
        layers.iter().enumerate().map(of).fold(Ball::zero(), |sum, thickness| sum + thickness)
    }

    /// S as stated, or by Eq. 14.
    fn static_factor_of(&self, written: &Written, parameter: Parameter, value: f64) -> Ball {
        let Some(concrete) = self.concrete() else { return written.number(parameter, value) };
        let (follows, strength, of) = match parameter {
            Parameter::Layer(index, _) => {
                let layer = &concrete.layers[index];
                (layer.follows_eq14, layer.strength, Parameter::Layer(index, LayerNumber::Strength))
            }
            _ => (concrete.follows_eq14, concrete.strength, Parameter::Strength),
        };
        if follows && strength > 0.0 && written.range(parameter).is_none() {
            semi_empirical::static_factor_in(written.number(of, strength))
        } else {
            written.number(parameter, value)
        }
    }

    /// Gives depths that are equal as decimals the same ball.
    fn unite_depths(&self, written: &Written, problem: &mut Problem<Ball>) {
        let (ends, exit) = self.written_depths(written);
        if ends.len() != problem.stages.len() {
            return;
        }
        let are_equal = |a: Option<Decimal>, b: Option<Decimal>| a.zip(b).is_some_and(|(a, b)| a.equals(b));
        let mut before: Option<(Option<Decimal>, Ball)> = None;
        for (stage, end) in problem.stages.iter_mut().zip(&ends) {
            if let Some((decimal, ball)) = before
                && are_equal(decimal, *end)
            {
                stage.end = ball;
            }
            if are_equal(exit, *end) {
                stage.end = problem.exit_depth;
            } else if stage.end == problem.exit_depth && stage.end.radius > 0.0 {
                // Two decimals of so many digits that their balls are the same.
                stage.end = stage.end.widened(TINY);
            }
            before = Some((*end, stage.end));
        }
    }

    /// The ends of the stages and the exit depth as decimals, where they are such.
    fn written_depths(&self, written: &Written) -> (Vec<Option<Decimal>>, Option<Decimal>) {
        let thickness = || written.decimal(Parameter::Thickness, self.thickness?);
        match &self.resistance {
            Resistance::Stages(stages) => {
                if self.forces.iter().any(|(_, force)| matches!(force, Force::Table(_))) {
                    return (Vec::new(), None);
                }
                let end = |(index, stage): (usize, &super::problem::Stage)| {
                    let is_place = index + 1 < stages.len();
                    is_place.then(|| written.decimal(Parameter::Stage(index, StageNumber::End), stage.end))?
                };
                (stages.iter().enumerate().map(end).collect(), thickness())
            }
            Resistance::Concrete(concrete) => {
                let mut ends = Vec::new();
                if concrete.crater_ratio != 0.0 {
                    let ratio = written.decimal(Parameter::CraterRatio, concrete.crater_ratio);
                    let diameter = written.decimal(Parameter::Diameter, concrete.diameter);
                    ends.push(ratio.zip(diameter).and_then(|(ratio, diameter)| ratio.times(diameter)));
                }
                let first = layer_beyond(&concrete.layers, concrete.crater_depth());
                let mut sum = Some(Decimal { digits: 0, exponent: 0 });
                for (index, layer) in concrete.layers.iter().enumerate() {
                    let thickness = written.decimal(Parameter::Layer(index, LayerNumber::Thickness), layer.thickness);
                    sum = sum.zip(thickness).and_then(|(sum, thickness)| sum.plus(thickness));
                    if Some(index) >= first {
                        ends.push(sum.filter(|_| index + 1 < concrete.layers.len()));
                    }
                }
                if concrete.layers.is_empty() {
                    ends.push(None);
                }
                let exit = if self.criterion != Criterion::FullDepth {
                    None
                } else if concrete.layers.is_empty() {
                    thickness()
                } else {
                    sum
                };
                (ends, exit)
            }
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::exchange::scene_file::SceneFile;

    fn problem(text: &str) -> Problem<Ball> {
        let file = SceneFile::from_toml(text, "scene.toml", &[]).unwrap();
        file.scene.enclosed(&file.written, None).unwrap()
    }

    fn slab(diameter: &str, thickness: &str, more: &str) -> String {
        format!(
            "[projectile]\nmass = \"2 kg\"\ndiameter = \"{diameter}\"\nnose = {{ shape = \"ogive\", caliber_radius_head = 3.1 }}\n\
             [target]\nstrength = \"36 MPa\"\ndensity = \"2300 kg/m3\"\nthickness = \"{thickness}\"\n\
             [resistance]\nk = 3\n[impact]\nvelocity = \"300.1 m/s\"\n{more}"
        )
    }

    fn lies_in(ball: Ball, text: &str) {
        // 17 digits beside the exact ones.
        let (low, high) = ball.interval();
        let value: f64 = text.parse().unwrap();
        assert!(low <= value && value <= high && high - low <= 2.0 * f64::EPSILON * value.abs(), "{ball:?} {text}");
        assert!(ball.radius <= 1e-28 * value, "{ball:?}");
    }

    /// mpmath, 40 digits, of the decimals: P = pi d²/4 S fc with S = 72/sqrt(36), Q with N* = 1/(3 psi) - 1/(24 psi²).
    #[test]
    fn coefficients_are_those_of_the_decimals() {
        let of = problem(&slab("50.1 mm", "300 mm", ""));
        lies_in(of.stages[1].static_force, "851626.3294551871");
        lies_in(of.stages[1].drag, "0.46788109409703093");
        lies_in(of.stages[0].end, "0.1503");
        lies_in(of.stages[0].stiffness, "5744546.13534595");
    }

    /// 100 mm and 50 mm are 0.15000000000000002 m as `f64`, behind k d = 0.15 m; as written they end there.
    #[test]
    fn a_layer_that_ends_at_k_d_as_written_and_not_as_rounded_is_refused() {
        let text = "[projectile]\nmass = 5\ndiameter = \"75 mm\"\nnose.factor = 0.5\n[resistance]\nk = 2\n[impact]\nvelocity = 250\n\
                    [[target.layer]]\nthickness = \"100 mm\"\nstrength = \"20 MPa\"\ndensity = 2300\n\
                    [[target.layer]]\nthickness = \"50 mm\"\nstrength = \"20 MPa\"\ndensity = 2300\n\
                    [[target.layer]]\nthickness = \"1 m\"\nstrength = \"100 MPa\"\ndensity = 2300\n";
        let file = SceneFile::from_toml(text, "layers.toml", &[]).unwrap();
        assert!(matches!(file.scene.enclosed(&file.written, None), Err(ResolveError::ChosenByRounding(_))));
    }

    /// H/d = 2.997945 + 2e-16, and the f64 nearest to that is 2.997945.
    #[test]
    fn a_branch_of_the_ndrc_relation_that_rounding_would_choose_is_refused() {
        let text = slab("10.2 mm", "30.579039000000002 mm", "[perforation]\ncriterion = \"ndrc\"\n");
        let file = SceneFile::from_toml(&text, "scene.toml", &[]).unwrap();
        assert!(matches!(file.scene.enclosed(&file.written, None), Err(ResolveError::ChosenByRounding(_))));
    }

    #[test]
    fn depths_that_are_equal_as_decimals_are_one_ball_and_others_are_not() {
        let exit_of = |diameter: &str, thickness: &str| {
            let of = problem(&slab(diameter, thickness, ""));
            (of.stages[0].end, of.exit_depth)
        };
        let (end, exit) = exit_of("33.4 mm", "100.2 mm");
        assert_eq!(end, exit);
        // Equal as f64, and not as written.
        let (end, exit) = exit_of("33.4 mm", "100.20000000000000000001 mm");
        assert!(end != exit && end.value() == exit.value());
        let (end, exit) = exit_of("33.4 mm", "100.3 mm");
        assert!(end.upper() < exit.lower());
    }
}
