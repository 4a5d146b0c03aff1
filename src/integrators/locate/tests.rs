use super::super::taylor::Series;
use super::*;
use proptest::prelude::*;

/// Coefficients of the product of `(t - root)` and of `((t - a)² + b²)`. Dyadic numbers: exact.
fn product(roots: &[f64], pairs: &[(f64, f64)]) -> Vec<f64> {
    let mut polynomial = vec![1.0];
    let mut times = |factor: &[f64]| {
        let mut next = vec![0.0; polynomial.len() + factor.len() - 1];
        for (i, a) in polynomial.iter().enumerate() {
            for (j, b) in factor.iter().enumerate() {
                next[i + j] += a * b;
            }
        }
        polynomial = next;
    };
    for root in roots {
        times(&[-root, 1.0]);
    }
    for (a, b) in pairs {
        times(&[a * a + b * b, -2.0 * a, 1.0]);
    }
    polynomial
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Roots and pairs are eighths, so the coefficients are exact and the roots are known with certainty.
    #[test]
    fn first_root_is_the_least_of_the_known_roots(
        roots in prop::collection::vec(-16_i32..48, 0..5),
        pairs in prop::collection::vec((-16_i32..48, 1_i32..16), 0..3),
        span in 1_i32..40,
    ) {
        let roots: Vec<f64> = roots.into_iter().map(|r| f64::from(r) / 8.0).collect();
        let pairs: Vec<(f64, f64)> =
            pairs.into_iter().map(|(a, b)| (f64::from(a) / 8.0, f64::from(b) / 8.0)).collect();
        // An end of the span between two eighths: a root on the very end is a test of its own.
        let span = f64::from(span) / 8.0 + 1.0 / 16.0;
        let least = roots.iter().copied().filter(|r| *r > 0.0 && *r < span).fold(f64::INFINITY, f64::min);
        let polynomial = product(&roots, &pairs);
        let found = first_root(&polynomial, span);
        if least.is_finite() {
            // p = g (t - root)^m nearby, so a rounding error e of its value moves the root by (e/g)^(1/m).
            let multiplicity = roots.iter().filter(|r| **r == least).count() as f64;
            let others: f64 = roots.iter().filter(|r| **r != least).map(|r| (least - r).abs()).product();
            let slope = others * pairs.iter().map(|(a, b)| (least - a).powi(2) + b * b).product::<f64>();
            let size = polynomial.iter().rev().fold(0.0, |sum, c| sum * span + c.abs());
            let noise = 8.0 * polynomial.len() as f64 * f64::EPSILON * size;
            let accuracy = 2.0 * (noise / slope).powf(1.0 / multiplicity);
            prop_assert!((found.unwrap() - least).abs() <= accuracy, "{found:?} for {least} within {accuracy:e}");
        } else {
            prop_assert_eq!(found, None);
        }
    }
}

#[test]
fn the_first_root_on_a_span_is_that_behind_its_start_to_its_end() {
    // (t - 1/2)² on a span with both ends positive, less or more by `off`.
    let touch = |off: f64| vec![0.25 + off, -1.0, 1.0];
    let behind_a_miss = |root: f64, near: f64, off: f64| product(&[root], &[(near, off)]);
    let mut cases = vec![
        ("a root at the end counts", vec![-1.0, 1.0], 1.0, Some((1.0, 0.0))),
        ("one at the start does not", vec![0.0, 1.0], 1.0, None),
        ("nor do two", vec![0.0, 0.0, -0.5, 1.0], 1.0, Some((0.5, 1e-15))),
        ("a negative root is none", vec![1.0, 1.0], 1.0, None),
        ("nothing has none", vec![], 1.0, None),
        ("nor has zero", vec![0.0], 1.0, None),
        ("a touch is found", touch(0.0), 2.0, Some((0.5, 1e-6))),
        ("a near miss is not", touch(1e-9), 2.0, None),
        ("of a pair in one step, the earlier", touch(-1e-10), 2.0, Some((0.5 - 1e-5, 1e-9))),
        // 12 epsilons of 1/4 + 2 + 4: 1.7e-14.
        ("a miss below the noise is a touch", touch(1.4e-14), 2.0, Some((0.5, 1e-6))),
        ("a miss above the noise is none", touch(2.1e-14), 2.0, None),
        ("where nothing differs from zero, the middle", product(&[0.5; 40], &[]), 1.0, Some((0.5, 0.0))),
    ];
    // A near miss has the boxes narrowed, and they must widen behind it, or their number runs out.
    for (near, off) in [(0.1, 1e-3), (0.1, 1e-5), (0.1, 1e-6), (0.296_875, 1.0 / 512.0)] {
        cases.push(("on a corner, the corner itself", behind_a_miss(0.5, near, off), 1.0, Some((0.5, 0.0))));
    }
    for root in [0.8, 0.95] {
        cases.push(("behind a near miss", behind_a_miss(root, 0.1, 1e-5), 1.0, Some((root, 1e-15))));
    }
    // A pair of complex roots by the real line has the boxes halved, so that their widths do not fill the span.
    for root in [1.001, 1.01, 1.1, 1.4] {
        for near in [0.1, 0.3, 0.55, 0.7, 0.8, 0.9, 0.95] {
            cases.extend([1e-2, 1e-3].map(|off| ("just behind the span", behind_a_miss(root, near, off), 1.0, None)));
        }
    }
    for (claim, polynomial, span, expected) in cases {
        let found = first_root(&polynomial, span);
        let is_there = match (found, expected) {
            (Some(found), Some((root, within))) => (found - root).abs() <= within,
            (found, expected) => found.is_none() && expected.is_none(),
        };
        assert!(is_there, "{claim}: {found:?}, not {expected:?}, of {polynomial:?}");
    }
}

#[test]
fn the_scale_of_a_polynomial_does_not_matter() {
    for scale in [1e-300, 1e-170, 1.0, 1e170, 1e300] {
        let root = first_root(&[-0.06 * scale, 0.5 * scale, -scale], 1.0).unwrap();
        assert!((root - 0.2).abs() < 2e-16, "{root} at scale {scale}");
    }
    // A power of two rounds nothing: simple, double and triple roots, the end, a near miss.
    let (apart, double, triple) =
        (product(&[0.2, 0.3], &[]), product(&[0.25, 0.25, 0.75], &[]), product(&[0.7; 3], &[]));
    for polynomial in [apart, double, triple, product(&[1.0], &[]), product(&[0.375, 0.5, 0.625], &[(0.1, 0.01)])] {
        let root = first_root(&polynomial, 1.0);
        assert!(root.is_some());
        for exponent in [-900, -500, 500, 900] {
            let scaled: Vec<f64> = polynomial.iter().map(|c| c * 2_f64.powi(exponent)).collect();
            assert_eq!(first_root(&scaled, 1.0), root, "{polynomial:?} times 2^{exponent}");
        }
    }
}

/// The law `F = 1` (mass one) from V = 1: rest at t = 1, x = 1/2.
fn parabola(t: f64) -> State {
    State { time: t, depth: t - 0.5 * t * t, velocity: 1.0 - t }
}

fn constant_force(end: f64) -> Stage {
    Stage { static_force: 1.0, stiffness: 0.0, viscosity: 0.0, drag: 0.0, end }
}

#[test]
fn a_step_over_both_crossings_of_a_boundary_finds_the_first() {
    // x = 3/8 is crossed at t = 1/2 and t = 3/2, x = 1/2 is touched at t = 1; the step of length 8 ends at x < 0.
    for (end, time, velocity) in [(0.375, 0.5, 0.5), (0.5, 1.0, 0.0), (0.5 - 0.5e-12, 1.0 - 1e-6, 1e-6)] {
        let law = constant_force(end);
        let Found::Inside(at_rest) = rest(&law, parabola, parabola(0.0), 8.0, &Closing::new(1e-16)) else {
            panic!("no rest found");
        };
        assert!((at_rest.time - 1.0).abs() < 1e-15 && (at_rest.depth - 0.5).abs() < 1e-16);
        let Found::Inside(passed) = passage(&law, parabola, at_rest, at_rest.time, true, &Closing::new(1e-16)) else {
            panic!("no passage found");
        };
        assert!((passed.time - time).abs() < 1e-10 && (passed.velocity - velocity).abs() < 1e-10, "{passed:?}");
        assert_eq!(passed.depth, end);
    }
}

#[test]
fn a_boundary_out_of_reach_sends_the_search_to_the_rest() {
    let law = constant_force(0.5 + 1e-9);
    assert_eq!(passage(&law, parabola, parabola(0.0), 8.0, false, &Closing::new(1e-16)), Found::RestFirst);
}

/// All four terms, none a round number, mass one.
fn every_term(end: f64) -> Stage {
    Stage { static_force: 1.1, stiffness: 0.7, viscosity: 0.3, drag: 0.9, end }
}

/// The flight of [`every_term`] from x = 0 at `velocity`, summed to round-off for short times.
fn course(velocity: f64) -> impl Fn(f64) -> State {
    let series = Series::<f64, 40>::new::<true, true, true>(&every_term(f64::INFINITY), velocity);
    move |t| series.at(t)
}

/// Time at which `value` changes its sign between 0 and `to`.
fn crossing(mut to: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut from, rising) = (0.0, value(to) > 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (from + to);
        if (value(middle) > 0.0) == rising { to = middle } else { from = middle }
    }
    0.5 * (from + to)
}

/// The constants of one law, measured: a wrong term leaves a correction of lower order, whose constant is far off.
#[test]
fn one_correction_is_of_fourth_order_and_states_its_error() {
    let closing = Closing::new(1e-16);
    let near = |value: f64, measured: f64| (value / measured - 1.0).abs() < 0.02;
    // By the quadratic far away, by the inverse series near by: error over t⁴, and the stated error over the true.
    for (velocity, constant, stated) in
        [(0.3, -0.374, 0.402), (0.2, -0.226, 0.262), (0.1, 0.0895, 4.09), (0.015, 0.0744, 3.28)]
    {
        let at = course(velocity);
        let rest = crossing(0.5, |t| at(t).velocity);
        let to = to_rest(&Jet::at(&every_term(f64::INFINITY), &at(0.0)), velocity, &closing);
        let (order, bound) = ((to.time - rest) / rest.powi(4), to.error / at(to.time).velocity.abs());
        assert!(near(order, constant) && near(bound, stated), "{velocity}: {order}, {bound}");
    }
    // The same for a part of the step to rest, over t⁵.
    for (velocity, part, constant, stated) in [
        (0.3, 0.9, -0.742, 9.75),
        (0.3, 0.5, 0.301, 4.19),
        (0.2, 0.2, 0.239, 4.49),
        (0.3, 0.05, -236.0, 2.11),
        (0.03, 0.05, -1.58e6, 1.51),
    ] {
        let at = course(velocity);
        let rest = crossing(0.5, |t| at(t).velocity);
        let law = every_term(part * at(rest).depth);
        let passage = crossing(rest, |t| at(t).depth - law.end);
        let to = to_depth(&law, &Jet::at(&law, &at(0.0)), &at(0.0), &closing).unwrap();
        let (order, bound) = ((to.time - passage) / passage.powi(5), to.error / (at(to.time).depth - law.end).abs());
        assert!(near(order, constant) && near(bound, stated), "{velocity}, {part}: {order}, {bound}");
    }
}

fn jet(first: f64, second: f64, third: f64) -> Jet<f64> {
    Jet { first, second, third }
}

/// Polynomials whose roots are known: the quadratic is exact where the cubic term is nothing, and one that would move
/// the trial by more than a quarter is left out.
#[test]
fn a_trial_far_from_rest_is_the_root_of_the_parabola() {
    let to = |velocity, jet: Jet<f64>| {
        let correction = to_rest(&jet, velocity, &Closing::new(1e-8));
        (correction.time, correction.error)
    };
    assert_eq!(to(1.0, jet(-1.0, 0.0, 1.5)), (1.25, 0.1875));
    assert_eq!(to(1.0, jet(-1.0, 0.0, 3.0)), (1.0, f64::INFINITY));
    assert_eq!(to(1.0, jet(0.0, 1.0, 0.0)), (f64::INFINITY, f64::INFINITY));
    // 3 t² - t + 0.004925: so near that the series serves, were its error not ten times the tolerance.
    assert!((to(0.004_925, jet(-1.0, 6.0, 0.0)).0 - 0.005).abs() < 1e-17);
}

/// The same for a boundary, `D = t + ...`.
#[test]
fn a_trial_far_from_a_boundary_is_the_root_of_the_parabola() {
    let to = |end, jet: Jet<f64>, tolerance| {
        let start = State { time: 0.0, depth: 0.0, velocity: 1.0 };
        let correction = to_depth(&constant_force(end), &jet, &start, &Closing::new(tolerance)).unwrap();
        (correction.time, correction.error)
    };
    // Higher terms that move the trial by half, or turn the speed round.
    assert_eq!(to(1.0, jet(0.0, -1.2, 0.0), 1e-8), (1.0, f64::INFINITY));
    assert_eq!(to(1.0, jet(0.0, -10.0, 40.0), 1e-8), (1.0, f64::INFINITY));
    // t - 3 t² = 0.004925: the series would be off by three times the tolerance.
    assert!((to(0.004_925, jet(-6.0, 0.0, 0.0), 1e-9).0 - 0.005).abs() < 1e-17);
}

fn uniform(t: f64) -> State {
    State { time: t, depth: t, velocity: 1.0 }
}

fn no_force(end: f64) -> Stage {
    Stage { static_force: 0.0, ..constant_force(end) }
}

#[test]
fn an_event_at_the_end_of_a_step_is_on_it_and_one_within_reach_behind_it_is_not() {
    let closing = Closing::new(1e-8);
    let law = constant_force(f64::INFINITY);
    assert_eq!(rest(&law, parabola, parabola(0.0), 1.0, &closing), Found::Inside(parabola(1.0)));
    assert_eq!(rest(&law, parabola, parabola(0.995), 0.999, &closing), Found::Beyond(parabola(0.999)));
    let pass = |end, from, span| passage(&no_force(end), uniform, uniform(from), span, false, &closing);
    assert_eq!(pass(1.0, 0.0, 1.0), Found::Inside(uniform(1.0)));
    assert_eq!(pass(0.9995, 0.995, 0.999), Found::Beyond(uniform(0.999)));
    // The speed vanishes at the end, short of the boundary; the law says nothing of the brake.
    assert_eq!(passage(&no_force(0.6), parabola, parabola(0.0), 1.0, false, &closing), Found::RestFirst);
}

/// Drag alone, M = 1, q = 2: V = 1/(1 + 2 t), x = ln(1 + 2 t)/2. The parabola at impact ends at x = 1/4.
#[test]
fn a_boundary_beyond_the_parabola_is_found_if_it_is_known_to_be_reached() {
    let law = Stage { drag: 2.0, ..no_force(0.6) };
    let at = |t: f64| State { time: t, depth: 0.5 * (2.0 * t).ln_1p(), velocity: 1.0 / (1.0 + 2.0 * t) };
    let find = |reached| passage(&law, at, at(0.0), 2.0, reached, &Closing::new(1e-16));
    assert_eq!(find(false), Found::RestFirst);
    let Found::Inside(passed) = find(true) else { panic!("no passage found") };
    assert!((passed.time - 0.5 * 1.2_f64.exp_m1()).abs() < 1e-14, "{passed:?}");
    assert!((passed.velocity - (-1.2_f64).exp()).abs() < 1e-14 && passed.depth == 0.6, "{passed:?}");
}

/// Laws a million times too weak, so that each correction leads out of the bracket.
#[test]
fn where_corrections_lead_astray_halving_finds_the_place() {
    let closing = Closing::new(1e-16);
    let weak = Stage { static_force: 1e-6, ..constant_force(0.3125) };
    let at = |t| State { time: t, depth: t, velocity: 0.3125 - t };
    let expected = State { time: 0.3125, depth: 0.3125, velocity: 0.0 };
    assert_eq!(rest(&weak, at, at(0.0), 1.0, &closing), Found::Inside(expected));
    let at = |t| State { time: t, depth: t, velocity: 1e-6 };
    let expected = State { velocity: 1e-6, ..expected };
    assert_eq!(passage(&no_force(0.3125), at, at(0.0), 1.0, false, &closing), Found::Inside(expected));
}

#[test]
fn a_boundary_touched_has_a_speed_of_zero_without_a_sign() {
    let touching = State { time: 0.0, depth: 1.0, velocity: -0.0 };
    let touched = at_depth(&constant_force(1.0), &touching, &jet(-1.0, 0.0, 0.0), 0.0);
    assert_eq!(touched.velocity.to_bits(), 0);
}
