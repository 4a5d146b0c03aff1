//! What must hold for any bytes, one function a target: run by cargo-fuzz, and over the corpus by `tests/fuzz_corpus.rs`.

use dashu_int::ops::Gcd;
use dashu_int::{IBig, Sign};
use penetrode::exchange::tables::CsvTable;
use penetrode::integrators::locate::{COEFFICIENTS_MAX, first_root};
use penetrode::physics::expression::{Jets, Known, LENGTH_MAX, Tape, Unit};
use penetrode::physics::units::Dimension;
use penetrode::physics::{Advice, Scene};
use penetrode::studies::Verdict;
use penetrode::studies::audit::{FormalOrders, Table, audit as judge};
use penetrode::studies::batch::{SCENES, Scenes};
use penetrode::studies::order::{Class, StepError, fit};

/// What is run on any bytes, and panics where a promise is broken.
type Check = fn(&[u8]);

/// The targets by name.
pub const TARGETS: [(&str, Check); 6] = [
    ("scene", scene),
    ("expression", expression),
    ("batch", batch),
    ("audit", audit),
    ("locate", locate),
    ("order", order),
];

/// A text is a scene that has an equation of motion, or is refused at a place in it, with a remedy.
pub fn scene(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Scene::from_toml(text, "fuzz.toml") {
        Ok(scene) => {
            // What the reader admits, the resolver does not refuse for its range.
            if let Some(speed) = scene.velocity {
                match scene.resolve(speed) {
                    Ok(problem) => {
                        assert!(problem.mass > 0.0 && problem.impact_speed >= 0.0 && !problem.stages.is_empty());
                        let finite = |s: &penetrode::physics::Stage| {
                            [s.static_force, s.stiffness, s.viscosity, s.drag].iter().all(|c| c.is_finite())
                        };
                        assert!(problem.stages.iter().all(finite), "{problem:?}");
                    }
                    Err(error) => assert!(!error.is_usage(), "admitted, then refused: {error}"),
                }
            }
        }
        Err(error) => {
            assert!(!error.message.is_empty() && !error.allowed.is_empty() && !error.help.is_empty(), "{error:?}");
            let place = error.place.as_ref().expect("a text has places");
            assert!(place.line <= 1 + text.matches('\n').count(), "{place:?}");
            let shown = error.render(false);
            assert!(!shown.chars().any(|c| c.is_control() && !matches!(c, '\n' | '\t')), "{shown:?}");
        }
    }
}

/// A text is a force that means the same in its own words, and says why it has no value or series where it has none, or it
/// is refused at a place in it, with a remedy.
pub fn expression(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let known = |name, value, unit| Known { name, value, unit };
    let known = [
        known("P", 848e3, Dimension::Force.into()),
        known("Q", 3.25, Dimension::Drag.into()),
        known("b", 0.15, Unit::NONE),
        known("v1", 50.0, Dimension::Velocity.into()),
        known("l", 0.05, Dimension::Length.into()),
    ];
    let read = |text: &str| Tape::read(text, &known, Dimension::Force.into());
    let tape = match read(text) {
        Ok(tape) => tape,
        Err(error) => {
            assert!(text.get(error.span.clone()).is_some(), "{text:?}: {error:?}");
            assert!(!error.message.is_empty() && !error.label.is_empty() && !error.help.is_empty(), "{error:?}");
            assert!(error.message.len() < 1000 && !error.message.contains(char::is_control), "{error:?}");
            return;
        }
    };
    let bound = tape.bind(tape.parameters());
    let own = tape.to_text();
    // More spaces may be more than are read.
    let again = (own.len() <= LENGTH_MAX).then(|| read(&own).expect("its own words are read"));
    for (x, v) in [(0.0, 0.0), (0.1, 300.0), (-1.0, 0.5)] {
        let value = bound.eval(x, v);
        assert!(value.is_finite() || bound.explain(x, v).is_some(), "{text:?}: {value}");
        if let Some(again) = &again {
            let other = again.bind(tape.parameters()).eval(x, v);
            assert!(other == value || (other.is_nan() && value.is_nan()), "{text:?} and {own:?}: {value} and {other}");
        }
        let mut jets = Jets::default();
        jets.start(&bound, &bound.sides(x, v));
        let first = jets.push(&bound, x, v);
        assert!(first == value || (first.is_nan() && value.is_nan()), "{text:?}: {first} and {value}");
        jets.push(&bound, v, -30.0);
    }
}

/// A table of scenes is refused, or each of its rows is a scene or a message of one line; chunks do not matter.
pub fn batch(data: &[u8]) {
    let rows = |chunk: usize| {
        let mut table = CsvTable::new("fuzz.csv", data, &SCENES).map_err(|error| error.to_string())?;
        let mut all = Vec::new();
        loop {
            let scenes = Scenes::Table(table.next_rows(chunk, None).map_err(|error| error.to_string())?);
            if scenes.is_empty() {
                return Ok::<_, String>(all);
            }
            all.extend(scenes.scenes(0..scenes.len()));
        }
    };
    let whole = rows(1024);
    // A refused table gives no rows in one chunk; in small chunks those in front of the fault come first.
    assert!(whole == rows(3));
    let lines = 1 + data.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    match whole {
        Ok(rows) => {
            assert!(rows.len() <= lines);
            for row in rows {
                match row {
                    Ok(scene) => assert!(scene.mass.is_finite()),
                    Err(error) => {
                        let message = error.to_string();
                        assert!(!message.is_empty() && message.len() < 500 && !message.contains(char::is_control));
                    }
                }
            }
        }
        Err(message) => assert!(message.starts_with("fuzz.csv") && !message.contains(char::is_control), "{message:?}"),
    }
}

/// A table of step sizes is refused at its place, or judged; no column with a NaN passes.
pub fn audit(data: &[u8]) {
    let table = match Table::read("fuzz.csv", data) {
        Ok(table) => table,
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with("fuzz.csv") && message.len() < 1000 && !error.help().is_empty(), "{message:?}");
            assert!(!message.contains(char::is_control), "{message:?}");
            return;
        }
    };
    for order in [None, Some(1.0), Some(2.0)] {
        // 1 and 2 are orders: only too few steps are refused here.
        let Ok(judged) = judge(&table, &FormalOrders::of_all(order), None, None) else { continue };
        for column in &judged.quantities {
            if column.points.iter().any(|point| !point.value.is_finite()) {
                assert!(column.verdict == Verdict::Failed, "{column:?}");
            }
            if column.verdict == Verdict::Passed {
                assert!(column.observed_order.is_some_and(|p| p > 0.0 && p.is_finite()), "{column:?}");
            }
        }
        serde_json::to_string(&judged).expect("a judgement is data");
    }
}

/// The points are refused for a number that is none, or fitted; their sequence does not matter.
pub fn order(data: &[u8]) {
    // Sixteen bytes a point: any numbers; fewer: small ones that make a study.
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().unwrap_or_default());
    let points: Vec<StepError> = match data.split_first() {
        Some((0, rest)) => rest.chunks_exact(16).map(|b| StepError::new(number(&b[..8]), number(&b[8..]))).collect(),
        Some((_, rest)) => rest
            .chunks_exact(3)
            .map(|b| StepError::new(f64::from(b[0] % 40).exp2(), f64::from(b[1] as i8) * f64::from(b[2] as i8).exp2()))
            .collect(),
        None => return,
    };
    let found = fit(&points);
    let mut reversed = points.clone();
    reversed.reverse();
    let is_bad = |p: &StepError| !(p.error.is_finite() && p.step > 0.0 && p.step.is_finite());
    match (found, fit(&reversed)) {
        (Ok(fit), Ok(again)) => {
            assert!(!points.iter().any(is_bad));
            assert!(!fit.reason.is_empty() && fit.points.len() == points.len());
            let mut steps: Vec<f64> = points.iter().map(|point| point.step).collect();
            steps.sort_by(f64::total_cmp);
            // Equal steps keep their sequence, and a sum its round-off.
            if steps.windows(2).all(|pair| pair[0] < pair[1]) {
                assert!(fit.class == again.class, "{fit:?} {again:?}");
            }
            if let Some(line) = fit.line {
                assert!(line.order.is_finite() && line.interval95[0] <= line.interval95[1], "{line:?}");
            }
            for formal in [1.0, 2.0] {
                if fit.verdict(formal) == Verdict::Passed {
                    assert!(fit.class == Class::Converging && fit.line.is_some(), "{fit:?}");
                }
            }
        }
        (Err(_), Err(_)) => {}
        (one, other) => panic!("{one:?} one way, {other:?} the other"),
    }
}

/// The first root in (0, 1] is where exact arithmetic has one, and none is missed.
///
/// Coefficients are small integers, so that Sturm's sequence is exact. Where the values cannot be distinguished from zero
/// by their rounding error, a root found there is right, too, as [`first_root`] says.
pub fn locate(data: &[u8]) {
    let count = data.len().min(COEFFICIENTS_MAX).min(12);
    let numbers = &data[..count];
    let coefficients: Vec<f64> = numbers.iter().map(|byte| f64::from(*byte as i8)).collect();
    let found = first_root(&coefficients, 1.0);
    let exact = Polynomial::new(numbers.iter().map(|byte| IBig::from(*byte as i8)).collect());
    // Roots at zero itself are not reported.
    let exact = exact.without_roots_at_zero();
    if exact.degree() == 0 {
        // A constant has no root, and the zero polynomial none that is first.
        assert!(found.is_none() || exact.is_zero(), "{coefficients:?}: {found:?}");
        return;
    }
    let size: f64 = coefficients.iter().map(|c| c.abs()).sum();
    let noise = 64.0 * coefficients.len() as f64 * f64::EPSILON * size;
    let value = |t: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let certified = exact.roots_in_unit_interval();
    match found {
        None => assert!(certified == 0, "{coefficients:?}: {certified} roots, and none found"),
        Some(root) => {
            assert!(root > 0.0 && root <= 1.0, "{coefficients:?}: {root}");
            let slope: f64 = coefficients.iter().enumerate().map(|(k, c)| k as f64 * c.abs()).sum();
            // A box of 2^-40 that may hold a touching root counts as one.
            let is_simple = exact.square_free().degree() == exact.degree();
            let width = if is_simple { f64::EPSILON } else { 2f64.powi(-40) };
            assert!(value(root).abs() <= noise + slope * width, "{coefficients:?}: {} at {root}", value(root));
            // Nothing in front of it, unless the values between cannot be distinguished from zero.
            if let Some(first) = exact.first_root_before(root) {
                let between = (0..=16).map(|i| first + (root - first) * f64::from(i) / 16.0);
                let largest = between.map(|t| value(t).abs()).fold(0.0, f64::max);
                assert!(largest <= noise, "{coefficients:?}: {root}, and before it {first}, {largest:e} between");
            }
        }
    }
}

/// A polynomial with integer coefficients, the constant first, the last not zero; empty for zero.
#[derive(Clone, Debug, PartialEq)]
struct Polynomial(Vec<IBig>);

impl Polynomial {
    fn new(mut coefficients: Vec<IBig>) -> Self {
        while coefficients.last().is_some_and(|c| *c == IBig::ZERO) {
            coefficients.pop();
        }
        Self(coefficients)
    }

    fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    fn degree(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    fn without_roots_at_zero(self) -> Self {
        Self(self.0.into_iter().skip_while(|c| *c == IBig::ZERO).collect())
    }

    fn derivative(&self) -> Self {
        Self::new(self.0.iter().enumerate().skip(1).map(|(k, c)| c * IBig::from(k)).collect())
    }

    /// Divided by the greatest common divisor of the coefficients: the numbers stay small, the signs as they are.
    fn primitive(self) -> Self {
        let mut divisor = IBig::ZERO;
        for c in self.0.iter().filter(|c| **c != IBig::ZERO) {
            divisor = if divisor == IBig::ZERO { c.clone() } else { IBig::from((&divisor).gcd(c)) };
        }
        let divisor = if divisor.sign() == Sign::Negative { -divisor } else { divisor };
        if divisor == IBig::ZERO { self } else { Self(self.0.iter().map(|c| c / &divisor).collect()) }
    }

    /// Quotient and remainder by `divisor`, both times a positive number.
    fn divide(&self, divisor: &Self) -> (Self, Self) {
        let lead = divisor.0.last().expect("no division by zero").clone();
        let scale = if lead.sign() == Sign::Negative { -lead.clone() } else { lead.clone() };
        let turn = if lead.sign() == Sign::Negative { IBig::from(-1) } else { IBig::ONE };
        let mut rest = self.0.clone();
        let mut quotient = vec![IBig::ZERO; (self.0.len() + 1).saturating_sub(divisor.0.len())];
        for shift in (0..quotient.len()).rev() {
            let factor = rest[shift + divisor.0.len() - 1].clone() * &turn;
            for c in quotient.iter_mut().chain(&mut rest) {
                *c *= &scale;
            }
            quotient[shift] += &factor;
            for (k, c) in divisor.0.iter().enumerate() {
                rest[shift + k] -= c * &factor;
            }
        }
        (Self::new(quotient), Self::new(rest))
    }

    /// The same roots, each once.
    fn square_free(&self) -> Self {
        let (mut a, mut b) = (self.clone(), self.derivative());
        while !b.is_zero() {
            let rest = a.divide(&b).1.primitive();
            (a, b) = (b, rest);
        }
        self.divide(&a).0.primitive()
    }

    /// Sturm's sequence of a polynomial without multiple roots.
    fn sturm(&self) -> Vec<Self> {
        let mut sequence = vec![self.clone(), self.derivative()];
        while let [.., a, b] = &sequence[..]
            && !b.is_zero()
        {
            let rest = a.divide(b).1.primitive();
            sequence.push(Self(rest.0.into_iter().map(|c| -c).collect()));
        }
        sequence.retain(|p| !p.is_zero());
        sequence
    }

    /// Sign of the value at `numerator/2^exponent`: -1, 0 or 1.
    fn sign_at(&self, numerator: &IBig, exponent: usize) -> i8 {
        let degree = self.degree();
        let mut value = IBig::ZERO;
        // Horner over the numerator, the powers of two multiplied in.
        for (k, c) in self.0.iter().enumerate().rev() {
            value = value * numerator + (c.clone() << (exponent * (degree - k)));
        }
        if value == IBig::ZERO {
            0
        } else if value.sign() == Sign::Negative {
            -1
        } else {
            1
        }
    }

    /// Different roots in (0, 1].
    fn roots_in_unit_interval(&self) -> usize {
        let sequence = self.square_free().sturm();
        changes(&sequence, &IBig::ZERO, 0) - changes(&sequence, &IBig::ONE, 0)
    }

    /// The first root in (0, `end`), to 2^-60, if there is one by a margin of 2^-50.
    fn first_root_before(&self, end: f64) -> Option<f64> {
        const EXPONENT: usize = 60;
        let sequence = self.square_free().sturm();
        let at_zero = changes(&sequence, &IBig::ZERO, 0);
        let count = |numerator: u64| at_zero - changes(&sequence, &IBig::from(numerator), EXPONENT);
        // A number of 53 bits times 2^60 is an integer where it is above 2^-7; below, it is rounded.
        let (mut low, mut high) = (0_u64, ((end - 2f64.powi(-50)).max(0.0) * 2f64.powi(60)) as u64);
        if count(high) == 0 {
            return None;
        }
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if count(middle) > 0 { high = middle } else { low = middle }
        }
        Some(high as f64 * 2f64.powi(-60))
    }
}

/// Changes of sign of the `sequence` at `numerator/2^exponent`, zeros left out.
fn changes(sequence: &[Polynomial], numerator: &IBig, exponent: usize) -> usize {
    let signs: Vec<i8> = sequence.iter().map(|p| p.sign_at(numerator, exponent)).filter(|sign| *sign != 0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
}
