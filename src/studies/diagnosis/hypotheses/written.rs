//! What a reader of scenes may have written down wrongly: a formula with one name, number, operator or bracket changed, or one number
//! of the scene in the place of another.
//!
//! Each formula is a text, and each slip in it that is still a formula and gives another value is a hypothesis, so that nobody has to think
//! of each.

use std::sync::LazyLock;

use super::super::slips::{Formula, slips};
use super::{Change, Hypothesis, Parameter};
use crate::physics::parameter::Parameter as Number;
use crate::physics::semi_empirical::NDRC_FIRST_BRANCH_END;
use crate::physics::{CraterStiffness, Criterion, Problem, Scene};

/// Numbers of a scene that may be taken for another one: the name that formulas have for each, and that of its cause.
const NUMBERS: [(&str, &str, Number); 9] = [
    ("M", "parameter:mass", Number::Mass),
    ("d", "parameter:diameter", Number::Diameter),
    ("N", "parameter:nose-factor", Number::NoseFactor),
    ("fc", "parameter:strength", Number::Strength),
    ("rho", "parameter:density", Number::Density),
    ("S", "parameter:S", Number::StaticFactor),
    ("B", "parameter:B", Number::InertiaFactor),
    ("k", "parameter:k", Number::CraterRatio),
    ("V0", "parameter:velocity", Number::Velocity),
];
/// Places among them.
const MASS: usize = 0;
const DIAMETER: usize = 1;
const STATIC_FACTOR: usize = 5;
const SPEED: usize = 8;
/// Those that enter several formulas: one that enters a single formula is wrong where that is.
const OF_SEVERAL: [&str; 4] = ["M", "d", "fc", "V0"];

/// What is formed of them, in order: its name, id, what it is, and its formula, which may use those before it.
///
/// P and Q are scaled with the area as well, so that a wrong one is wrong in both.
const FORMULAS: [(&str, &str, &str, &str); 8] = [
    ("S", "parameter:S", "S by Eq. 14", "72/(fc/1e6)^0.5"),
    ("A", "parameter:area", "the area", "pi/4*d^2"),
    ("D", "parameter:k", "the depth D of the crater", "k*d"),
    ("P", "parameter:static-force", "the static force P", "pi/4*d^2*S*fc"),
    ("Q", "parameter:drag", "the drag Q", "pi/4*d^2*N*B*rho"),
    (
        "c",
        "parameter:crater-stiffness",
        "the crater stiffness c, where none is stated,",
        "M*(P + Q*V0^2)/(D*(M + D*Q))",
    ),
    (
        "X",
        "parameter:criterion",
        "the depth that perforates a thin target by ndrc",
        "d*(3.19 - sqrt(3.19^2 - 4*0.718*H/d))/(2*0.718)",
    ),
    ("X", "parameter:criterion", "the depth that perforates a thick target by ndrc", "d*(H/d - 1.32)/1.24"),
];
/// The square of V behind the crater: where it is formed so, what that is, and its formula.
const SPEEDS: [(Where, &str, &str); 3] = [
    (Where::Stated, "V² behind the crater, where c is stated,", "V0^2 - c*D^2/M"),
    (Where::Follows, "V² behind the crater, where c follows from the other numbers,", "(M*V0^2 - D*P)/(M + D*Q)"),
    (Where::Always, "V² behind the crater", "V0^2 - c*D^2/M"),
];

/// By what the scene says of c.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Where {
    Stated,
    Follows,
    Always,
}

const EQ14: usize = 0;
const AREA: usize = 1;
const DEPTH: usize = 2;
const STATIC_FORCE: usize = 3;
const DRAG: usize = 4;
const STIFFNESS: usize = 5;
const THIN: usize = 6;
const THICK: usize = 7;

/// All names in order: the numbers, then what is formed but for S, which is one of the numbers, and of the criterion.
const NAMES: [&str; 16] = ["M", "d", "N", "fc", "rho", "S", "B", "k", "V0", "A", "D", "P", "Q", "c", "H", "X"];
/// The place of H among them.
const THICKNESS: usize = 14;

/// The place among [`NAMES`] of what formula `which` gives.
const fn place_of(which: usize) -> usize {
    match which {
        EQ14 => STATIC_FACTOR,
        THIN | THICK => THICKNESS + 1,
        _ => NUMBERS.len() + which - 1,
    }
}

/// A value of each name.
type Values = [f64; NAMES.len()];

/// Values at which formulas are compared.
const SAMPLES: [Values; 2] = [
    [5.3, 0.071, 0.62, 3.7e7, 2310.0, 11.8, 1.23, 2.6, 287.0, 3.96e-3, 0.1846, 1.73e6, 6.97, 1.1e7, 0.17, 0.06],
    [0.19, 0.0137, 0.83, 8.1e7, 1970.0, 7.9, 0.87, 1.7, 613.0, 1.47e-4, 0.02329, 9.4e4, 0.209, 2.3e6, 0.033, 0.011],
];
/// Relative difference of values that are two.
const TWO: f64 = 1e-6;

/// A number or formula of a scene as somebody wrote it.
#[derive(Debug)]
pub(in super::super) struct Written {
    /// In place of what.
    of: Of,
    text: Formula,
    /// What stands in the place of the second number, where two are exchanged.
    exchanged: Option<(usize, Formula)>,
    /// Whether it rests in the crater where the spring stops it, whatever V behind the crater is.
    pub rests_by_energy: bool,
}

/// What is written otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    /// The number with this place among [`NUMBERS`].
    Number(usize),
    /// The formula with this place among [`FORMULAS`].
    Formula(usize),
    /// V² behind the crater.
    Speed(Where),
}

/// `text`, in which [`NAMES`] may stand.
fn read(text: &str) -> Option<Formula> {
    Formula::read(text, &NAMES)
}

/// The formulas as they should be.
static RIGHT: LazyLock<Vec<Formula>> = LazyLock::new(|| FORMULAS.iter().filter_map(|(.., text)| read(text)).collect());

/// The numbers of `scene`, and nothing yet of what is formed of them.
fn values_of(scene: &Scene) -> Option<Values> {
    let mut values = [f64::NAN; NAMES.len()];
    for (value, (.., number)) in values.iter_mut().zip(NUMBERS) {
        *value = number.get(scene).ok()?;
    }
    values[THICKNESS] = scene.thickness.unwrap_or(f64::NAN);
    Some(values)
}

impl Written {
    /// The square of V behind the crater of `problem`, which is that of `scene`, where it is written so.
    pub(in super::super) fn crater_speed_squared(&self, scene: &Scene, problem: &Problem) -> Option<f64> {
        let Of::Speed(place) = self.of else { return None };
        let follows = scene.concrete()?.crater_stiffness == CraterStiffness::Continuous;
        if place == if follows { Where::Stated } else { Where::Follows } {
            return None;
        }
        let mut values = values_of(scene)?;
        let (crater, tunnel) = (problem.stages[problem.crater?], problem.stages.last()?);
        for (formula, value) in [
            (DEPTH, crater.end),
            (STIFFNESS, crater.stiffness),
            (STATIC_FORCE, tunnel.static_force),
            (DRAG, tunnel.drag),
        ] {
            values[place_of(formula)] = value;
        }
        Some(self.text.value(&values))
    }

    /// What a solver that has it so makes of `scene`.
    pub(in super::super) fn problem(&self, scene: &Scene) -> Option<Problem> {
        let (concrete, mut problem) = (scene.concrete()?, scene.problem().ok()?);
        let right = values_of(scene)?;
        let mut values = right;
        if let Of::Number(place) = self.of {
            values[place] = self.text.value(&right);
            if let Some((place, text)) = &self.exchanged {
                values[*place] = text.value(&right);
            }
        }
        let right_area = RIGHT.get(AREA)?.value(&values);
        for (formula, right) in RIGHT.iter().enumerate() {
            let is_of_thin = values[THICKNESS] <= NDRC_FIRST_BRANCH_END * values[DIAMETER];
            let is_used = match formula {
                EQ14 => concrete.follows_eq14,
                THIN => is_of_thin,
                THICK => !is_of_thin,
                _ => true,
            };
            if is_used {
                let text = if self.of == Of::Formula(formula) { &self.text } else { right };
                let is_scaled = formula == STATIC_FORCE || formula == DRAG;
                let area = if is_scaled { values[place_of(AREA)] / right_area } else { 1.0 };
                values[place_of(formula)] = area * text.value(&values);
            }
        }
        let of = |formula: usize| values[place_of(formula)];
        (problem.mass, problem.impact_speed) = (values[MASS], values[SPEED]);
        if scene.criterion == Criterion::Ndrc {
            problem.exit_depth = of(THIN);
        }
        if let Some(crater) = problem.crater {
            let crater = &mut problem.stages[crater];
            crater.end = of(DEPTH);
            if concrete.crater_stiffness == CraterStiffness::Continuous {
                crater.stiffness = of(STIFFNESS);
            }
        }
        let tunnel = problem.stages.last_mut()?;
        (tunnel.static_force, tunnel.drag) = (of(STATIC_FORCE), of(DRAG));
        Some(problem)
    }
}

/// Those of `texts` that are formulas with a value that neither `right` has, nor a factor of it, nor one before them: factors of terms and
/// numbers are hypotheses of their own.
fn others(texts: &[String], right: &Formula) -> Vec<Formula> {
    let values = |formula: &Formula| SAMPLES.map(|sample| formula.value(&sample));
    let is_same = |a: &[f64; 2], b: &[f64; 2]| a.iter().zip(b).all(|(a, b)| a == b || (a / b - 1.0).abs() <= TWO);
    let right = values(right);
    let is_factor = |own: &[f64; 2]| (own[0] / right[0] / (own[1] / right[1]) - 1.0).abs() <= TWO;
    let (mut known, mut found) = (Vec::new(), Vec::new());
    for formula in texts.iter().filter_map(|text| read(text)) {
        let own = values(&formula);
        let is_finite = own.iter().all(|value| value.is_finite());
        if is_finite && !is_factor(&own) && !known.iter().any(|known| is_same(known, &own)) {
            known.push(own);
            found.push(formula);
        }
    }
    found
}

/// One for each slip. They are made once and last as long as the program.
static SLIPS: LazyLock<Vec<Hypothesis>> = LazyLock::new(|| {
    let hypothesis = |id: &str, statement: String, written: Written| Hypothesis {
        id: Box::leak(id.to_owned().into_boxed_str()),
        statement: Box::leak(statement.into_boxed_str()),
        parameter: Parameter::None,
        changes: Box::leak(Box::new([Change::Written(Box::leak(Box::new(written)))])),
    };
    let mut all = Vec::new();
    for (which, (right, (name, id, what, _))) in RIGHT.iter().zip(FORMULAS).enumerate() {
        // The numbers, and what was formed before it.
        let formed = if which > STIFFNESS {
            &NAMES[THICKNESS..]
        } else {
            &NAMES[NUMBERS.len()..place_of(which).max(NUMBERS.len())]
        };
        let names = NAMES[..NUMBERS.len()].iter().chain(formed).copied().filter(|known| *known != name);
        let names: Vec<&str> = names.collect();
        for text in others(&slips(&right.text, &names), right) {
            let statement = format!("{what} is formed as {}, not as {}", text.text, right.text);
            all.push(hypothesis(
                id,
                statement,
                Written { of: Of::Formula(which), text, exchanged: None, rests_by_energy: false },
            ));
        }
    }
    let names = ["M", "V0", "D", "P", "Q", "c"];
    for (place, what, right) in SPEEDS {
        let Some(right) = read(right) else { continue };
        for rests_by_energy in [false, true] {
            for text in others(&slips(&right.text, &names), &right) {
                let statement = format!("{what} is formed as {}, not as {}", text.text, right.text);
                let written = Written { of: Of::Speed(place), text, exchanged: None, rests_by_energy };
                all.push(hypothesis("stage-end-velocity", statement, written));
            }
        }
    }
    let names = NUMBERS.map(|(name, ..)| name);
    for (place, (name, id, _)) in NUMBERS.into_iter().enumerate() {
        let Some(right) = read(name) else { continue };
        let texts = if OF_SEVERAL.contains(&name) { slips(name, &names) } else { Vec::new() };
        for text in others(&texts, &right) {
            let statement = format!("{} is taken for {name}", text.text);
            all.push(hypothesis(
                id,
                statement,
                Written { of: Of::Number(place), text, exchanged: None, rests_by_energy: false },
            ));
        }
        for (other, other_name) in names.into_iter().enumerate().skip(place + 1) {
            let (Some(text), Some(own)) = (read(other_name), read(name)) else { continue };
            let statement = format!("{name} and {other_name} are exchanged");
            let written =
                Written { of: Of::Number(place), text, exchanged: Some((other, own)), rests_by_energy: false };
            all.push(hypothesis("parameters-exchanged", statement, written));
        }
    }
    all
});

/// Every slip.
pub(in super::super) fn slips_of_scenes() -> &'static [Hypothesis] {
    &SLIPS
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::super::super::questions::questions;
    use super::*;

    #[test]
    fn formulas_as_they_should_be_give_the_problem_of_the_scene() {
        assert_eq!(RIGHT.len(), FORMULAS.len());
        for question in questions(3, 200, true) {
            let scene = question.scene.unwrap();
            for (which, (.., text)) in FORMULAS.iter().enumerate() {
                let text = read(text).unwrap();
                let problem = Written { of: Of::Formula(which), text, exchanged: None, rests_by_energy: false }
                    .problem(&scene)
                    .unwrap();
                let right = scene.problem().unwrap();
                let is_near = |a: f64, b: f64| a == b || (a / b - 1.0).abs() < 1e-14;
                assert!(is_near(problem.exit_depth, right.exit_depth), "{}: {problem:?}", question.id);
                for (law, right) in problem.stages.iter().zip(&right.stages) {
                    let pairs = [
                        (law.static_force, right.static_force),
                        (law.stiffness, right.stiffness),
                        (law.drag, right.drag),
                        (law.end, right.end),
                    ];
                    assert!(pairs.iter().all(|(a, b)| is_near(*a, *b)), "{}: {problem:?}", question.id);
                }
            }
        }
    }

    #[test]
    fn a_wrong_area_is_wrong_in_p_and_q_and_a_wrong_diameter_in_the_crater_too() {
        let scene = crate::testing::shipped("paper-slab");
        let right = scene.problem().unwrap();
        let written = |of: Of, text: &str| {
            let text = read(text).unwrap();
            Written { of, text, exchanged: None, rests_by_energy: false }.problem(&scene).unwrap()
        };
        let ratios = |wrong: &Problem| {
            let [(crater, tunnel), (right_crater, right_tunnel)] =
                [wrong, &right].map(Problem::crater_depth_and_tunnel);
            [crater / right_crater, tunnel.static_force / right_tunnel.static_force, tunnel.drag / right_tunnel.drag]
        };
        let are = |found: [f64; 3], expected: [f64; 3]| {
            found.iter().zip(expected).all(|(found, expected)| (found / expected - 1.0).abs() < 1e-14)
        };
        let area = written(Of::Formula(AREA), "2*pi/4*d^2");
        assert!(are(ratios(&area), [1.0, 2.0, 2.0]), "{area:?}");
        let diameter = written(Of::Number(DIAMETER), "2*d");
        assert!(are(ratios(&diameter), [2.0, 4.0, 4.0]), "{diameter:?}");
    }
}
