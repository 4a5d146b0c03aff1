use std::fmt::Write;

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use dashu_int::IBig;
use twofloat::TwoFloat;

use super::parse::{Binary, Function, Node, Term};
use super::*;
use crate::exchange::diagnostic::Fault;
use crate::physics::Scalar;
use crate::physics::units::Dimension;
use crate::testing::Random;

/// What the expressions of these tests know.
fn known() -> Vec<Known<'static>> {
    let known = |name, value, dimension: Option<Dimension>| Known { name, value, unit: dimension.into() };
    vec![
        known("P", 848e3, Some(Dimension::Force)),
        known("Q", 3.25, Some(Dimension::Drag)),
        known("R", 5e4, Some(Dimension::Force)),
        known("S", 8e6, Some(Dimension::Stiffness)),
        known("b", 0.15, None),
        known("n", 1.5, None),
        known("v1", 50.0, Some(Dimension::Velocity)),
        known("l", 0.05, Some(Dimension::Length)),
    ]
}

fn force(text: &str) -> Bound {
    let tape = Tape::read(text, &known(), Dimension::Force.into());
    let tape = tape.unwrap_or_else(|error| panic!("{text}: {error:?}"));
    tape.bind(tape.parameters())
}

fn plain(text: &str) -> Bound {
    let tape = Tape::read(text, &known(), Unit::NONE).unwrap_or_else(|error| panic!("{text}: {error:?}"));
    tape.bind(tape.parameters())
}

fn value(text: &str) -> f64 {
    plain(text).eval(2.0, 3.0)
}

#[test]
fn powers_bind_tightest_and_to_the_right_and_signs_stay_outside() {
    for (text, expected) in [
        ("1 + 2*3", 7.0),
        ("2*3 + 1", 7.0),
        ("1 - 2 - 3", -4.0),
        ("8/4/2", 1.0),
        ("8/4*2", 4.0),
        ("2^3^2", 512.0),
        ("(2^3)^2", 64.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("2^-1", 0.5),
        ("2^-1*4", 2.0),
        ("2^-2^2", 0.0625),
        ("--2 + +3", 5.0),
        ("2*-3", -6.0),
        ("2 - -3", 5.0),
        ("-2*3", -6.0),
        ("2e3 + 1.5 + 1e-3 + .5 + 5.", 2007.001),
        ("2 + e", 2.0 + std::f64::consts::E),
        ("cos(pi)", -1.0),
        ("\t( 1 )\n", 1.0),
        ("-(x/l)^2", -1600.0),
        ("V/v1 + x/l", 40.06),
        ("min(1, 2) + max(3, 4)", 5.0),
        ("max ( 3,4 )", 4.0),
        ("abs(-3)", 3.0),
        ("sqrt(16) + exp(0) + log(e) + log10(1000)", 9.0),
        ("tanh(0) + sin(0) + atan(1)*4", std::f64::consts::PI),
        ("sqrt((x/l)^2)", 40.0),
        ("abs(-x)/l", 40.0),
        ("0^0 + (x/l - 40)^0", 2.0),
    ] {
        assert_eq!(value(text), expected, "{text}");
    }
}

#[test]
fn units_fit_all_through() {
    for text in [
        "P + Q*V^2",
        "P*(1 + b*log(1 + V/v1)) + S*x",
        "P*(V/v1)^n + R*(V/v1)^1.5",
        "sqrt(P*Q)*V",
        "sqrt(P^2 + (Q*V^2)^2)",
        "max(P - S*x, 0)",
        "0",
        "min(P, abs(Q*V^2))",
        "P*tanh(x/l)*exp(-V/v1)/cos(b)",
        "Q*V^(1 + 1)",
        "P*V^-1*v1",
        "-P*2^b + R",
    ] {
        force(text);
    }
}

#[test]
fn a_tape_says_what_it_uses_and_reads_back_from_its_own_text() {
    let text = " P*( 1+b*log(1 +V/v1) )-R *max(b,-2e-3)*2^-1";
    let tape = Tape::read(text, &known(), Dimension::Force.into()).unwrap();
    assert_eq!(tape.to_text(), "P*(1 + b*log(1 + V/v1)) - R*max(b, -2e-3)*2^-1");
    assert_eq!((tape.depends_on_x(), tape.depends_on_v()), (false, true));
    let used: Vec<&str> = known().iter().enumerate().filter(|(i, _)| tape.uses(*i)).map(|(_, k)| k.name).collect();
    assert_eq!(used, ["P", "R", "b", "v1"]);
    let again = Tape::read(&tape.to_text(), &known(), Dimension::Force.into()).unwrap();
    let at = |tape: &Tape| tape.bind(tape.parameters()).eval(0.1, 200.0);
    assert_eq!(at(&tape), at(&again));
}

fn refused(text: &str) -> ExpressionError {
    match Tape::read(text, &known(), Dimension::Force.into()) {
        Ok(tape) => panic!("{text} is read: {tape:?}"),
        Err(error) => error,
    }
}

#[test]
fn ten_mistakes_are_underlined_with_what_is_allowed_and_what_to_do() {
    let mut shown = String::new();
    for text in [
        "P + Q*V",
        "P + Q V^2",
        "P + Q*v^2",
        "P + R*V^1.5",
        "P*log(1 + V)",
        "P*(1 + b*ln(V/v1))",
        "P + (Q*V^2",
        "P + Q*V^",
        "P*b^(V/v1)",
        "Q*V",
        "P + Q*V² ",
        "P*sqrt(V)",
    ] {
        let ExpressionError { span, message, label, help } = refused(text);
        let error = Fault::new(span, message, label, help).in_file("force", text);
        let rendered = error.render(false);
        // Frame and empty lines are the same in all.
        let lines = rendered.lines().filter(|line| line.contains(char::is_alphanumeric) || line.contains('┬'));
        lines.for_each(|line| writeln!(shown, "{}", line.trim_end()).unwrap());
    }
    snapbox::assert_data_eq!(shown, snapbox::file!["snapshots/mistakes.txt"].raw());
}

#[test]
fn a_refusal_names_the_place() {
    for (text, place, message) in [
        ("", "", "the expression is empty"),
        ("  ", "  ", "the expression is empty"),
        ("P +", "+", "an operand is missing behind `+`"),
        ("* P", "*", "an operand is missing before `*`"),
        ("P + * R", "+", "an operand is missing behind `+`"),
        ("P*()", "(", "an operand is missing behind `(`"),
        ("P)", ")", "`)` closes nothing"),
        ("max(P, R", "(", "`(` is not closed"),
        ("max(P R)", "R", "an operator is missing before `R`"),
        ("max(P,)", ",", "an operand is missing behind `,`"),
        ("max(P)", "max(P)", "`max` takes two arguments, here are 1"),
        ("P*sqrt(1,5)", "sqrt(1,5)", "`sqrt` takes one argument, here are 2"),
        ("P*1,5", ",", "a comma outside of `min` and `max`"),
        ("P**2", "**", "a power is written `^`"),
        ("2 P", "P", "an operator is missing before `P`"),
        ("P 2.5", "2.5", "an operator is missing before `2.5`"),
        ("P(2)", "P", "`P` is no function"),
        ("P*exq(2)", "exq", "unknown function `exq`"),
        ("P*exp 2", "exp", "the function `exp` has no brackets"),
        ("P*1e400", "1e400", "`1e400` is beyond the largest number of 64 bits"),
        ("P*1e-400", "1e-400", "`1e-400` is below 2.3e-308, where 64 bits lose its digits"),
        ("P + p", "p", "unknown name `p`"),
        ("P + $", "$", "`$` is no part of an expression"),
        ("P + [R]", "[", "`[` is no part of an expression"),
        ("P - (V)", "(V)", "`(V)` is m/s, here a force (N) is subtracted"),
        ("P + b", "b", "`b` is a plain number, here a force (N) is added"),
        ("b + P", "b", "`b` is a plain number, here a force (N) is added"),
        ("max(Q*V, P)", "Q*V", "`Q*V` is kg/s, here a force (N) is compared"),
        ("P*(V + x)", "x", "`x` is m, here a velocity (m/s) is added"),
        ("P*exp(V + x)", "V", "`V` is m/s, here a plain number is added"),
        ("P*sin(x)", "x", "`x` is m, and `sin` takes a plain number"),
        ("P*b^P", "P", "the exponent `P` is N"),
        ("Q*V^b", "V", "`V` is m/s, and its exponent `b` is a parameter"),
        ("P*V^128", "V", "the unit of `V` has a power beyond 127"),
        ("P*V^-1", "P*V^-1", "`P*V^-1` is kg/s, a force (N) is wanted"),
        ("P*V", "P*V", "`P*V` is kg m²/s³, a force (N) is wanted"),
        ("b", "b", "`b` is a plain number, a force (N) is wanted"),
        ("1/x", "1/x", "`1/x` is 1/m, a force (N) is wanted"),
    ] {
        let error = refused(text);
        assert_eq!((&text[error.span.clone()], &error.message[..]), (place, message), "{text}");
        assert!(!error.label.is_empty() && !error.help.is_empty(), "{error:?}");
    }
    let helps = |text| refused(text).help;
    assert_eq!(helps("P + Q*v^2"), "did you mean `V`?");
    assert_eq!(helps("P*ln(b)"), "did you mean `log`?");
    assert_eq!(helps("P + F0"), "add `F0` to [parameters], with its unit");
    assert_eq!(helps("P*(2*V)^1.5"), "divide by a parameter of the same unit, as in `(a/b)^1.5`");
}

#[test]
fn length_and_depth_are_bounded() {
    let nested = |depth: usize| format!("{}P{}", "(".repeat(depth), ")".repeat(depth));
    force(&nested(NESTING_MAX));
    assert!(refused(&nested(NESTING_MAX + 1)).message.contains("64 brackets"));
    assert!(refused(&format!("P*{}1", "-".repeat(NESTING_MAX + 1))).message.contains("64 brackets"));
    assert!(refused(&format!("P*b{}", "^b".repeat(NESTING_MAX + 1))).message.contains("64 brackets"));
    assert!(refused(&"(".repeat(LENGTH_MAX)).message.contains("64 brackets"));
    // A sum is as long as it likes, and counts as no depth.
    let sum = format!("P{}", "+P".repeat(LENGTH_MAX / 2 - 1));
    assert_eq!(force(&sum).eval(0.0, 0.0), 848e3 * (LENGTH_MAX / 2) as f64);
    assert!(refused(&format!("{sum}+P")).message.contains("4097 bytes"));
}

#[test]
fn equal_terms_are_one_and_constants_are_no_steps() {
    let steps = |text| force(text).registers() - 2;
    // V², and P + Q times it.
    assert_eq!(steps("P + Q*V^2"), 2);
    assert_eq!(steps("P*(2 + b)^n/3 + sqrt(P*R) - Q*V^2"), 2);
    // A product that two terms use stays, and is no part of either.
    assert_eq!(steps("(P + Q*V^2)*(1 + Q*V^2/P)"), 6);
    assert_eq!(
        steps("Q*V^2 + Q*V^2*tanh(Q*V^2/P) + P*tanh(V^2*Q/P)"),
        steps("Q*V^2 + Q*V^2*tanh(Q*V^2/P) + P*tanh(Q*V^2/P)")
    );
    assert_eq!(steps("P"), 0);
    let sine = steps("P*sin(x/l)");
    assert_eq!(steps("P*sin(x/l)*cos(x/l)"), sine + 1);
}

#[test]
fn parameters_take_other_values_and_their_derivatives() {
    use num_dual::Dual64;
    let tape = Tape::read("P + R*(V/v1)^n", &known(), Dimension::Force.into()).unwrap();
    let mut values = tape.parameters().to_vec();
    values[0] = 1e6;
    values[5] = 2.0;
    assert_eq!(tape.bind(&values).eval(0.0, 100.0), 1.2e6);
    let mut duals: Vec<Dual64> = values.iter().map(|value| Dual64::from_re(*value)).collect();
    duals[5].eps = 1.0;
    // d/dn of R u^n = R u^n log u.
    let by_exponent = tape.bind(&duals).eval(Dual64::from_re(0.0), Dual64::from_re(100.0));
    approx::assert_relative_eq!(by_exponent.eps, 5e4 * 4.0 * 2.0_f64.ln(), max_relative = 1e-15);
    assert_eq!(tape.bind(&duals).eval(Dual64::from_re(0.0), Dual64::from_re(0.0)).eps, 0.0);
}

#[test]
fn the_variable_in_which_an_expression_is_smooth_at_rest_is_found() {
    for (text, fall) in [
        ("P + Q*V^2", Fall::Power(1)),
        ("P + R*(V/v1)^1.5", Fall::Power(2)),
        ("P + R*(V/v1)^(1/3) + R*sqrt(V/v1)*V/v1", Fall::Power(6)),
        ("P + R*(V/v1)^0.25 + R*sqrt(V/v1)*V/v1", Fall::Power(4)),
        ("P*(1 + V/v1)^1.5", Fall::Power(1)),
        ("P*(x/l)^1.5", Fall::Power(1)),
        ("P*(x/l*V^3/v1^3)^0.5", Fall::Power(2)),
        ("P*sqrt(V^2/v1^2)", Fall::Power(1)),
        ("P*sin(b)*sqrt(exp(x/l)*V/v1)", Fall::Power(2)),
        ("P*(1 + b*log(V/v1))", Fall::Exponential),
        ("P*(1 + b*log10(x/l*V^2/v1^2))", Fall::Exponential),
        ("P*(1 + b*log(1 + V/v1))", Fall::Power(1)),
        ("P*(1 + b*log(2 + x/l))", Fall::Power(1)),
        // At 70 m/s, the side on which V counts: V is above v1.
        ("P*(1 + b*log(max(V/v1, 1)))", Fall::Exponential),
        ("P*(1 + b*log(min(V/v1, 1)))", Fall::Power(1)),
        ("P*max((V/v1)^0.23, 1) + Q*V^2", Fall::Exponential),
        ("P*min((V/v1)^0.23, 1) + Q*V^2", Fall::Power(1)),
    ] {
        let bound = force(text);
        assert_eq!(bound.falling(&bound.sides(0.1, 70.0)).fall, fall, "{text}");
    }
}

#[test]
fn a_velocity_that_falls_in_a_known_way_has_the_series_of_any_other() {
    const ORDERS: usize = 12;
    for text in [
        "P + R*(V/v1)^1.5 + Q*V^2",
        "P*(1 + b*log(V/v1)) + R*(V/v1)^0.3*x/l",
        "P*log10(2*V^2/v1^2) + R*sqrt(x/l*V/v1)",
        "P*max(log(V/v1), b) + R*max((V/v1)^0.3, b)",
    ] {
        let bound = force(text);
        let (x, v) = (0.1, 70.0);
        let sides = bound.sides(x, v);
        for fall in [Fall::Power(1), Fall::Power(3), Fall::Exponential] {
            let falling = Falling { fall, ..(*bound.falling(&sides)).clone() };
            let (mut known, mut any) = (Jets::default(), Jets::default());
            known.start_falling(&bound, &sides, &falling);
            any.start(&bound, &sides);
            let mut velocity = v;
            for k in 0..ORDERS {
                if k > 0 {
                    velocity = fall.coefficient(k, 1.0, velocity);
                }
                let depth = if k < 2 { 0.1 } else { 0.0 };
                let (one, other) = (known.push(&bound, depth, velocity), any.push(&bound, depth, velocity));
                assert!((one - other).abs() <= 1e-12 * 2e6, "{text}, {fall:?}, order {k}: {one:e} and {other:e}");
            }
            // V and its slope along s, beside their series.
            let s = 0.125;
            let mut sum = v;
            let mut term = v;
            for k in 1..40 {
                term = fall.coefficient(k, 1.0, term);
                sum += term * 0.125_f64.powi(k as i32);
            }
            approx::assert_relative_eq!(v * fall.left(s), sum, max_relative = 1e-15);
            let slope = (fall.left(s - 1e-6) - fall.left(s + 1e-6)) / 2e-6;
            approx::assert_relative_eq!(fall.slope(s), slope, max_relative = 1e-9);
        }
    }
}

#[test]
fn a_term_without_a_value_is_named() {
    for (text, x, v, shown) in [
        ("P*sqrt(1 - V/v1)", 0.0, 200.0, "`1 - V/v1`"),
        ("P*log(x/l)", 0.0, 200.0, "`log(x/l)` has no value at x = 0 m, V = 200 m/s: the logarithm of 0"),
        ("P/(x/l)", 0.0, 1.0, "`P/(x/l)` has no value at x = 0 m, V = 1 m/s: 848000 is divided by zero"),
        ("P*(x/l)^-2", 0.0, 1.0, "`(x/l)^-2` has no value at x = 0 m, V = 1 m/s: 1 is divided by zero"),
        ("P*(b - V/v1)^n", 0.0, 50.0, "`(b - V/v1)^n` has no value at x = 0 m, V = 50 m/s: -0.85 to the power 1.5"),
        (
            "P*exp(V/v1)^9",
            0.0,
            5000.0,
            "`exp(V/v1)^9` has no value at x = 0 m, V = 5000 m/s: the value is not finite in 64 bits",
        ),
        ("max(P*log10(-b), 0)", 0.0, 1.0, "`log10(-b)` has no value at x = 0 m, V = 1 m/s: the logarithm of -0.15"),
    ] {
        let bound = force(text);
        assert!(!bound.eval(x, v).is_finite(), "{text}");
        let error = bound.explain(x, v).unwrap();
        if text.contains("sqrt") {
            assert_eq!(error.reason, Reason::RootOfNegative(-3.0));
            assert_eq!(&text[error.span], "sqrt(1 - V/v1)");
        } else {
            assert_eq!(error.to_string(), shown);
        }
        assert_eq!(bound.explain(0.02, 5.0).is_some(), text.contains("-b"), "{text}");
    }
}

#[test]
fn a_root_of_zero_has_a_value_and_a_slope_and_no_series() {
    let bound = force("P + R*(V/v1)^1.5");
    assert_eq!(bound.gradient(0.1, 0.0), (848e3, 0.0, 0.0));
    assert_eq!(bound.explain(0.1, 0.0), None);
    assert_eq!(bound.explain_series(0.1, 0.0).unwrap().reason, Reason::BranchPoint);
    assert_eq!(bound.explain_series(0.1, 1.0), None);
    assert!(series(&bound, 3).iter().skip(1).any(|c| !c.is_finite()));
}

/// Series of `bound` where x = V = 0 and V grows as t.
fn series(bound: &Bound, orders: usize) -> Vec<f64> {
    let mut jets = Jets::default();
    jets.start(bound, &bound.sides(0.0, 0.0));
    (0..orders).map(|k| jets.push(bound, if k == 2 { 0.5 } else { 0.0 }, if k == 1 { 1.0 } else { 0.0 })).collect()
}

#[test]
fn whole_powers_of_zero_have_exact_series() {
    for (text, at, coefficient) in
        [("(V/v1)^3", 3, 0.02_f64.powi(3)), ("(V/v1)^11", 11, 0.02_f64.powi(11)), ("(V/v1)^70", 70, 0.0)]
    {
        for (k, found) in series(&plain(text), 24).into_iter().enumerate() {
            approx::assert_relative_eq!(found, if k == at { coefficient } else { 0.0 }, max_relative = 1e-14);
        }
    }
}

#[test]
fn a_series_stays_on_the_side_it_was_started_with() {
    let bound = plain("abs(1 - V/v1) + max(V/v1 - 1, b)");
    assert_eq!(bound.switches().len(), 2);
    let (start, slope) = (40.0, 100.0);
    assert_eq!(bound.sides(0.0, start)[..], [true, false]);
    for (sides, expected) in
        [([true, false], [0.2 + 0.15, -2.0]), ([false, false], [-0.2 + 0.15, 2.0]), ([false, true], [-0.2 - 0.2, 4.0])]
    {
        let mut jets = Jets::default();
        jets.start(&bound, &sides);
        let found = [jets.push(&bound, 0.0, start), jets.push(&bound, 0.0, slope)];
        approx::assert_relative_eq!(found[..], expected[..], max_relative = 1e-14);
        // The place where the side changes is in the series of the switch: 1 - V/v1 = 0.2 - 2 t.
        approx::assert_relative_eq!(jets.register(bound.switches()[0])[..], [0.2, -2.0][..], max_relative = 1e-14);
    }
}

// Random expressions.

/// A random expression: a plain number or a force, of so many levels.
struct Grammar<'a>(&'a mut Random);

impl Grammar<'_> {
    fn one_of<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.0.below(of.len())]
    }

    fn plain(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.one_of(&["(V/v1)", "(x/l)", "(V/v1)", "b", "n", "2", "0.5", "pi", "1e-2"]).to_owned();
        }
        let below = depth - 1;
        match self.0.below(10) {
            0..=2 => format!("({} {} {})", self.plain(below), self.one_of(&["+", "-", "*", "/"]), self.plain(below)),
            3..=5 => {
                let function = self.one_of(&["sqrt", "exp", "log", "log10", "tanh", "sin", "cos", "atan", "abs"]);
                format!("{function}({})", self.plain(below))
            }
            6 | 7 => {
                let exponent = self
                    .one_of(&["2", "3", "1.5", "0.5", "-1", "0.3", "n", "b", "7", "-0.5", "2.5", "(1 + b)", "-n^2"]);
                format!("({})^{exponent}", self.plain(below))
            }
            8 => format!("{}({}, {})", self.one_of(&["min", "max"]), self.plain(below), self.plain(below)),
            _ => format!("(-{})", self.plain(below)),
        }
    }

    fn force(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.one_of(&["P", "R", "Q*V^2", "S*x", "P*V/v1"]).to_owned();
        }
        let below = depth - 1;
        match self.0.below(8) {
            0..=2 => format!("({} {} {})", self.force(below), self.one_of(&["+", "-"]), self.force(below)),
            3 | 4 => format!("{}*{}", self.force(below), self.plain(below)),
            5 => format!("{}/({})", self.force(below), self.plain(below)),
            6 => format!("{}({}, {})", self.one_of(&["min", "max"]), self.force(below), self.force(below)),
            _ => format!("sqrt({}*abs({}))", self.force(below), self.force(below)),
        }
    }

    /// Depth and velocity of a flight, now and then at rest or at impact.
    fn state(&mut self) -> (f64, f64) {
        let x = if self.0.chance(0.1) { 0.0 } else { self.0.log_uniform(1e-3, 1.0) };
        let v = if self.0.chance(0.1) { 0.0 } else { self.0.log_uniform(1.0, 1000.0) };
        (x, v)
    }
}

/// Derivatives by x and V, and the sum of |dF/dz z| over all terms z, which each of them rounds by: in reverse order.
fn adjoints(nodes: &[Node], values: &[f64]) -> (f64, f64, f64) {
    let mut adjoint = vec![0.0; nodes.len()];
    let (mut by_x, mut by_v, mut size) = (0.0, 0.0, 0.0);
    *adjoint.last_mut().unwrap() = 1.0;
    for (index, node) in nodes.iter().enumerate().rev() {
        let slope: f64 = adjoint[index];
        if slope == 0.0 {
            continue;
        }
        size += (slope * values[index]).abs();
        let value = values[index];
        match node.term {
            Term::Number(_) | Term::Parameter(_) => {}
            Term::X => by_x += slope,
            Term::V => by_v += slope,
            Term::Negative(of) => adjoint[of] -= slope,
            Term::Call(function, of) => {
                let z = values[of];
                adjoint[of] += slope
                    * match function {
                        Function::Sqrt => 0.5 / value,
                        Function::Exp => value,
                        Function::Log => 1.0 / z,
                        Function::Log10 => 1.0 / (z * std::f64::consts::LN_10),
                        Function::Tanh => z.cosh().powi(-2),
                        Function::Sin => z.cos(),
                        Function::Cos => -z.sin(),
                        Function::Atan => 1.0 / (1.0 + z * z),
                        Function::Abs => {
                            if z >= 0.0 {
                                1.0
                            } else {
                                -1.0
                            }
                        }
                    };
            }
            Term::Binary(binary, a, b) => {
                let (one, other) = (values[a], values[b]);
                let (by_one, by_other) = match binary {
                    Binary::Add => (1.0, 1.0),
                    Binary::Subtract => (1.0, -1.0),
                    Binary::Multiply => (other, one),
                    Binary::Divide => (1.0 / other, -one / (other * other)),
                    // The exponent has neither x nor V in it, and whatever it rounds by is counted as one of the base.
                    Binary::Power => (other * one.powf(other - 1.0), 0.0),
                    Binary::Min => {
                        if one - other >= 0.0 {
                            (0.0, 1.0)
                        } else {
                            (1.0, 0.0)
                        }
                    }
                    Binary::Max => {
                        if one - other >= 0.0 {
                            (1.0, 0.0)
                        } else {
                            (0.0, 1.0)
                        }
                    }
                };
                if binary == Binary::Power && one != 0.0 {
                    size += (slope * value * other * one.abs().ln()).abs();
                }
                adjoint[a] += slope * by_one;
                adjoint[b] += slope * by_other;
            }
        }
    }
    (by_x, by_v, size)
}

type Big = FBig<HalfEven, 2>;

/// A number to so many `bits`.
fn big(value: f64, bits: usize) -> Big {
    Big::try_from(value).unwrap().with_precision(bits).value()
}

/// The value of the last of the terms `nodes` where each has one, term by term in big floats.
fn exact(nodes: &[Node], parameters: &[f64], x: &Big, v: &Big, bits: usize) -> Big {
    let mut values: Vec<Big> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let value = match node.term {
            Term::Number(number) => big(f64::from_bits(number), bits),
            Term::Parameter(index) => big(parameters[index], bits),
            Term::X => x.clone(),
            Term::V => v.clone(),
            Term::Negative(of) => -values[of].clone(),
            Term::Call(function, of) => {
                let z = &values[of];
                match function {
                    Function::Sqrt => z.sqrt(),
                    Function::Exp => z.exp(),
                    Function::Log => z.ln(),
                    Function::Log10 => z.ln() / big(10.0, bits).ln(),
                    Function::Tanh => z.tanh(),
                    Function::Sin => z.sin(),
                    Function::Cos => z.cos(),
                    Function::Atan => z.atan(),
                    Function::Abs => {
                        if *z < Big::ZERO {
                            -z.clone()
                        } else {
                            z.clone()
                        }
                    }
                }
            }
            Term::Binary(binary, a, b) => {
                let (a, b) = (&values[a], &values[b]);
                match binary {
                    Binary::Add => a + b,
                    Binary::Subtract => a - b,
                    Binary::Multiply => a * b,
                    Binary::Divide => a / b,
                    Binary::Power => {
                        let exponent = b.to_f64().value();
                        if exponent.fract() == 0.0 {
                            a.powi(IBig::from(exponent as i64))
                        } else if *a == Big::ZERO {
                            a.clone()
                        } else {
                            a.powf(b)
                        }
                    }
                    Binary::Min => {
                        if a < b {
                            a.clone()
                        } else {
                            b.clone()
                        }
                    }
                    Binary::Max => {
                        if a > b {
                            a.clone()
                        } else {
                            b.clone()
                        }
                    }
                }
            }
        };
        // Zero and one may come without a precision.
        values.push(value.with_precision(bits).value());
    }
    values.pop().unwrap()
}

/// How many of the random cases had what.
#[derive(Debug, Default)]
struct Tally {
    cases: usize,
    /// No value, and the reason said.
    without_value: usize,
    /// No power series, and the reason said.
    without_series: usize,
    /// Coefficients beyond f64.
    overflown: usize,
    compared: usize,
    /// Largest error over the size of rounding, in units of 2^-53.
    worst_value: f64,
    worst_slope: f64,
    worst_sum: f64,
    worst_coefficient: f64,
    /// The same in units of 2^-104.
    worst_in_double_doubles: f64,
}

const ORDERS: usize = 24;

/// `cases` random expressions at random states.
fn random_cases(seed: u64, cases: usize, digits_every: usize) -> Tally {
    let known = known();
    let parameters: Vec<f64> = known.iter().map(|known| known.value).collect();
    let mut random = Random::new(seed);
    let mut tally = Tally::default();
    for case in 0..cases {
        let levels = 1 + random.below(5);
        let mut grammar = Grammar(&mut random);
        let text = grammar.force(levels);
        let (x, v) = grammar.state();
        let tape = match Tape::read(&text, &known, Dimension::Force.into()) {
            Ok(tape) => tape,
            Err(error) => panic!("{text}: {error:?}"),
        };
        check(&tape, &parameters, (x, v), case % digits_every == 0, &mut tally);
    }
    tally
}

/// What must hold for `tape` at a state.
fn check(tape: &Tape, parameters: &[f64], (x, v): (f64, f64), with_digits: bool, tally: &mut Tally) {
    const ROUNDING: f64 = f64::EPSILON / 2.0;
    let text = tape.text();
    let bound = tape.bind(parameters);
    tally.cases += 1;
    let value = bound.eval(x, v);
    if let Some(error) = bound.explain(x, v) {
        tally.without_value += 1;
        assert!(!text[error.span].is_empty());
        return;
    }
    assert!(value.is_finite(), "{text} at {x}, {v}: {value}");
    let nodes = parse::parse(text, &known()).unwrap();
    let values = tape_values(&nodes, parameters, x, v);
    let (by_x, by_v, size) = adjoints(&nodes, &values);
    assert!((value - values.last().unwrap()).abs() <= 100.0 * ROUNDING * size || size.is_nan(), "{text}: {value}");

    let gradient = bound.gradient(x, v);
    let falls = gradient.2 < -1e-9 * size / v.abs().max(1.0);
    assert!(!(bound.never_falls_with_v() && x >= 0.0 && v >= 0.0 && falls), "{text} at {x}, {v}: {gradient:?}");
    assert_eq!(gradient.0, value, "{text}");
    let mut jets = Jets::default();
    jets.start(&bound, &bound.sides(x, v));
    // x = x0 + v0 t + 3 t²/2 and V = x' + something of its own.
    let (xs, vs) = ([x, v + 0.1, 1.5], [v, 30.0, -40.0]);
    let at = |series: &[f64], k: usize| series.get(k).copied().unwrap_or(0.0);
    let coefficients: Vec<f64> = (0..ORDERS).map(|k| jets.push(&bound, at(&xs, k), at(&vs, k))).collect();
    assert_eq!(coefficients[0], value, "{text}");
    if bound.explain_series(x, v).is_some() {
        tally.without_series += 1;
        return;
    }
    if !coefficients.iter().all(|c| c.is_finite()) {
        // cos(exp(100)) turns so fast that the coefficients overflow.
        let mut all = (0..bound.registers()).flat_map(|register| jets.register(register));
        assert!(all.any(|c| c.is_finite() && c.abs() > 1e100), "{text} at {x}, {v}: {coefficients:?}");
        tally.overflown += 1;
        return;
    }
    if !size.is_finite() || size == 0.0 {
        return;
    }
    tally.compared += 1;
    // First order: by dual numbers, by reverse derivatives, and by the series.
    let along = |by_x: f64, by_v: f64| (by_x * xs[1], by_v * vs[1]);
    let (dual_x, dual_v) = along(gradient.1, gradient.2);
    let (reverse_x, reverse_v) = along(by_x, by_v);
    // The shortest time in which a term changes as much as it is, or the whole as much as its terms are.
    let changes = |first: f64, series: &[f64]| {
        let time = |(k, c): (usize, &f64)| (first / c).abs().powf(1.0 / k as f64);
        series.iter().enumerate().skip(1).filter(|(_, c)| first != 0.0 && **c != 0.0).map(time).fold(1.0, f64::min)
    };
    let registers = (0..bound.registers()).map(|register| jets.register(register));
    let time = registers.map(|series| changes(series[0], series)).fold(changes(size, &coefficients), f64::min);
    let slope_error = |slope: f64| (slope - coefficients[1]).abs() * time / (ROUNDING * size);
    tally.worst_slope = tally.worst_slope.max(slope_error(dual_x + dual_v)).max(slope_error(reverse_x + reverse_v));
    assert!(
        tally.worst_slope < 1e3,
        "{text} at {x}, {v}: {} {} {}",
        coefficients[1],
        dual_x + dual_v,
        reverse_x + reverse_v
    );
    // All orders: the sum against the value there.
    let t = 0.125 * time;
    let horner = |series: &[f64]| series.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let there = (horner(&xs), horner(&vs));
    if bound.sides(there.0, there.1) == bound.sides(x, v) && bound.explain(there.0, there.1).is_none() {
        let error = (horner(&coefficients) - bound.eval(there.0, there.1)).abs() / (ROUNDING * size);
        tally.worst_sum = tally.worst_sum.max(error);
        assert!(error < 1e3, "{text} at {x}, {v}: {} {}", horner(&coefficients), bound.eval(there.0, there.1));
    }
    // Exactly at a kink it is the digits' own choice on which side they go on.
    let at_kink = bound.switches().iter().any(|switch| jets.register(*switch)[0] == 0.0);
    if with_digits && !at_kink {
        check_digits(tape, parameters, (&xs, &vs), &coefficients, (time, size), tally);
    }
}

/// Values of all terms, each occurrence apart.
fn tape_values(nodes: &[Node], parameters: &[f64], x: f64, v: f64) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(nodes.len());
    for node in nodes {
        values.push(match node.term {
            Term::Number(bits) => f64::from_bits(bits),
            Term::Parameter(index) => parameters[index],
            Term::X => x,
            Term::V => v,
            Term::Negative(of) => -values[of],
            Term::Binary(binary, a, b) => tape::binary(binary, values[a], values[b]),
            Term::Call(function, of) => tape::call(function, values[of]),
        });
    }
    values
}

/// The first coefficients in f64 and in double-doubles against divided differences in 768 bits, at times 2^-110 apart.
fn check_digits(
    tape: &Tape,
    parameters: &[f64],
    (xs, vs): (&[f64], &[f64]),
    coefficients: &[f64],
    (time, size): (f64, f64),
    tally: &mut Tally,
) {
    const BITS: usize = 768;
    const POINTS: usize = 6;
    let text = tape.text();
    let nodes = parse::parse(text, &known()).unwrap();
    let step = big(time, BITS) >> 110;
    let at = |series: &[f64], t: &Big| series.iter().rev().fold(Big::ZERO, |sum, c| sum * t + big(*c, BITS));
    let times: Vec<Big> = (0..POINTS).map(|j| &step * big(j as f64, BITS)).collect();
    let mut table: Vec<Big> = times.iter().map(|t| exact(&nodes, parameters, &at(xs, t), &at(vs, t), BITS)).collect();
    let fine = |value: f64| TwoFloat::from(value);
    let bound = tape.bind(&parameters.iter().copied().map(fine).collect::<Vec<_>>());
    let mut jets = Jets::default();
    jets.start(&bound, &bound.sides(fine(xs[0]), fine(vs[0])));
    for k in 0..POINTS {
        let of = |series: &[f64]| fine(series.get(k).copied().unwrap_or(0.0));
        let found_fine = jets.push(&bound, of(xs), of(vs));
        let off =
            |found: Big, unit: f64| (found - &table[0]).to_f64().value().abs() * time.powi(k as i32) / (unit * size);
        let error = off(big(coefficients[k], BITS), f64::EPSILON / 2.0);
        let error_fine = off(big(found_fine.hi(), BITS) + big(found_fine.lo(), BITS), <TwoFloat as Scalar>::EPSILON);
        let worst = if k == 0 { &mut tally.worst_value } else { &mut tally.worst_coefficient };
        *worst = worst.max(error);
        tally.worst_in_double_doubles = tally.worst_in_double_doubles.max(error_fine);
        assert!(error < 1e3 && error_fine < 1e4, "{text} at {xs:?}, {vs:?}, order {k}: {error:e}, {error_fine:e}");
        for j in 0..POINTS - 1 - k {
            table[j] = (&table[j + 1] - &table[j]) / (&times[j + 1 + k] - &times[j]);
        }
        table.pop();
    }
}

#[test]
fn random_expressions_agree_with_dual_numbers_and_with_their_digits() {
    let tally = random_cases(1, 2000, 40);
    assert!(tally.compared > 500, "{tally:?}");
}

#[test]
#[ignore = "two minutes"]
fn a_hundred_thousand_random_expressions_agree_with_dual_numbers_and_with_their_digits() {
    let tally = random_cases(2, 100_000, 10);
    println!("{tally:?}");
    assert!(tally.compared > 25_000, "{tally:?}");
}

/// Shortest time of a call in 100 blocks of 100 (µs).
fn microseconds(mut call: impl FnMut()) -> f64 {
    let block = |call: &mut dyn FnMut()| {
        let start = std::time::Instant::now();
        (0..100).for_each(|_| call());
        start.elapsed().as_secs_f64() * 1e4
    };
    (0..100).map(|_| block(&mut call)).fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "times, of a release build"]
fn times_of_reading_values_gradients_and_series_of_24_coefficients() {
    use std::hint::black_box;
    println!("{:36} {:>8} {:>8} {:>8} {:>8} {:>8}", "µs", "read", "bind", "value", "gradient", "series");
    for text in [
        "P + Q*V^2",
        "P + Q*V^2 + R*(V/v1)^1.5",
        "P + R*(V/v1)^1.8",
        "(P + Q*V^2)*(1 + 0.2*exp(-V/v1))",
        "P*(1 + b*log(1 + V/v1)) + Q*V^2",
        "P*tanh(x/l) + Q*V^2 + 2*R",
        "P*atan(x/l) + max(Q*V^2, R)",
    ] {
        let known = known();
        let read = || Tape::read(black_box(text), &known, Dimension::Force.into()).unwrap();
        let tape = read();
        let bound = tape.bind(tape.parameters());
        let mut jets = Jets::default();
        let mut series = || {
            jets.start(&bound, &bound.sides(0.1, 200.0));
            let (mut x, mut v) = (0.1, 200.0);
            for k in 1..=24 {
                let force = jets.push(&bound, x, v);
                // A unit of time of 0.1 ms, and a mass of 2 kg.
                (x, v) = (1e-4 * v / f64::from(k), -0.5e-4 * force / f64::from(k));
            }
            black_box(v);
        };
        let times = [
            microseconds(|| drop(black_box(read()))),
            microseconds(|| drop(black_box(tape.bind(black_box(tape.parameters()))))),
            microseconds(|| {
                black_box(bound.eval(black_box(0.1), black_box(200.0)));
            }),
            microseconds(|| {
                black_box(bound.gradient(black_box(0.1), black_box(200.0)));
            }),
            microseconds(&mut series),
        ];
        println!("{text:36} {}", times.map(|time| format!("{time:8.4}")).join(" "));
    }
}
