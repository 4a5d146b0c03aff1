#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
use super::noise::Noise;
use super::*;

type Kind = fn(&mut Noise) -> f64;

/// What an event at a random place in the step makes of the error: all within a factor of (0, 1).
const KINDS: [(&str, Kind); 4] = [
    ("u", |r| r.uniform()),
    ("1 - 4 u²", |r| 1.0 - (2.0 * r.uniform() - 1.0).powi(2)),
    ("|sin|", |r| (std::f64::consts::TAU * r.uniform()).sin().abs()),
    ("u - 0.3", |r| r.uniform() - 0.3),
];

/// The fit to the errors that `error` gives of the steps.
fn fitted(steps: impl IntoIterator<Item = f64>, mut error: impl FnMut(f64) -> f64) -> OrderFit {
    fit(&steps.into_iter().map(|h| StepError::new(h, error(h))).collect::<Vec<_>>()).unwrap()
}

fn power(noise: &mut Noise, n: usize, order: f64, kind: Kind) -> Vec<StepError> {
    let steps = noise.steps(n, 1e-2, 3.0);
    // Round-off far below, so that only the noise is looked at.
    let point = |h: f64, u: f64| StepError { step: h, error: h.powf(order) * u, round_off: Some(1e-30) };
    steps.into_iter().map(|h| point(h, kind(noise))).collect()
}

#[test]
fn residuals_of_the_line_are_orthogonal_to_both_columns() {
    // Centred columns are orthogonal but for rounding: the case in which the decomposition of nalgebra 0.35 fails.
    let mut noise = Noise(12);
    for _ in 0..300 {
        let x: Vec<f64> = noise.steps(120, 1e-2, 3.0).iter().map(|h| h.ln()).collect();
        let y: Vec<f64> = x.iter().map(|x| 2.0 * x + noise.uniform().ln()).collect();
        let line = line(&x, &y).unwrap();
        let residual = |i: usize| y[i] - line.centre[1] - line.slope * (x[i] - line.centre[0]);
        let (sum, moment, square) = (0..120)
            .map(|i| (residual(i), x[i] - line.centre[0]))
            .fold((0.0, 0.0, 0.0), |(sum, moment, square), (r, x)| (sum + r, moment + r * x, square + r * r));
        assert!(f64::abs(sum) < 1e-10 && f64::abs(moment) < 1e-10, "{sum:e} {moment:e}");
        assert!((square / 118.0 / line.scatter.powi(2) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn student_t_matches_the_tables() {
    for (level, dof, expected) in [
        (0.05, 1, 12.706_204_736),
        (0.05, 2, 4.302_652_730),
        (0.05, 3, 3.182_446_305),
        (0.05, 58, 2.001_717_484),
        (0.001, 4, 8.610_301_581),
        (0.001, 30, 3.645_958_635),
        (1e-6, 1, 636_619.772_367),
    ] {
        let t = student_t(level, dof);
        assert!((t / expected - 1.0).abs() < 1e-9, "t({level}, {dof}) = {t}, not {expected}");
    }
}

#[test]
fn bands_keep_their_level_for_the_noise_of_steps() {
    let mut noise = Noise(1);
    for (name, kind) in KINDS {
        let t = student_t(1e-3, 58);
        let (fits, mut misses) = (25_000, 0);
        for _ in 0..fits {
            let x: Vec<f64> = noise.steps(60, 1e-2, 3.0).iter().map(|h| h.ln()).collect();
            let y: Vec<f64> = x.iter().map(|x| 2.0 * x + kind(&mut noise).abs().ln()).collect();
            let line = line(&x, &y).unwrap();
            misses += usize::from((line.slope - 2.0).abs() > t * line.scatter / line.spread.sqrt());
        }
        // 25 expected of a normal noise; 45 is four standard deviations above.
        assert!(misses <= 45, "{name}: {misses} of {fits} outside the band of 1e-3");
    }
}

#[test]
fn a_right_order_passes_and_one_off_by_one_fails_for_every_noise() {
    let mut noise = Noise(2);
    for (name, kind) in KINDS {
        for order in [1.0, 2.0] {
            for _ in 0..300 {
                let fit = fit(&power(&mut noise, 120, order, kind)).unwrap();
                let line = fit.line.unwrap();
                assert_eq!(fit.verdict(order), Verdict::Passed, "{name}, order {order}: {line:?}");
                for off in [-1.0, 1.0] {
                    assert_eq!(fit.verdict(order + off), Verdict::Failed, "{name}, order {order}: {line:?}");
                }
            }
        }
    }
}

#[test]
fn an_order_off_by_a_half_fails_with_120_points() {
    let mut noise = Noise(3);
    for (name, kind) in KINDS {
        let trials = 400;
        let caught = (0..trials)
            .filter(|_| fit(&power(&mut noise, 120, 1.5, kind)).unwrap().verdict(2.0) == Verdict::Failed)
            .count();
        assert!(caught * 100 >= trials * 99, "{name}: {caught} of {trials}");
    }
}

/// Laws of the error over the step, each with its class and the verdict on an order.
#[test]
fn only_what_converges_with_the_order_passes() {
    type Law = fn(f64, &mut Noise) -> f64;
    let laws: [(&str, Law, Class, f64, Verdict); 8] = [
        ("a next term, order 1", |h, _| -3.0 * h * (1.0 + h), Class::Converging, 1.0, Verdict::Passed),
        ("a next term, order 2", |h, _| -3.0 * h * h * (1.0 + h), Class::Converging, 2.0, Verdict::Passed),
        ("pure round-off", |h, r| 1e-16 * r.normal() / h.sqrt(), Class::AtFloor, 2.0, Verdict::Undecided),
        ("zeros", |_, _| 0.0, Class::AtFloor, 2.0, Verdict::Undecided),
        ("diverging", |h, _| 1e-4 / h, Class::Diverging, 1.0, Verdict::Failed),
        ("constant", |_, _| 1e-4, Class::Undecided, 2.0, Verdict::Failed),
        // Convergence to something else by one part in a million is no floor.
        ("levelling off", |h, _| h * h + 1e-6, Class::Undecided, 2.0, Verdict::Failed),
        (
            "alternating",
            |h, _| h * h * if h.log2().round() % 2.0 == 0.0 { 1.0 } else { -1.0 },
            Class::Oscillating,
            2.0,
            Verdict::Undecided,
        ),
    ];
    for (name, law, class, order, verdict) in laws {
        let mut noise = Noise(4);
        let steps = match name {
            "alternating" => (0..12).map(|i| 0.5_f64.powi(i)).collect(),
            "levelling off" => noise.steps(60, 1e-1, 4.0),
            _ => noise.steps(60, 1e-2, 3.0),
        };
        let fit = fitted(steps, |h| law(h, &mut noise));
        assert_eq!((fit.class, fit.verdict(order)), (class, verdict), "{name}: {:?} {}", fit.line, fit.reason);
        assert!(fit.line.is_none_or(|line| verdict != Verdict::Passed || (line.order - order).abs() < 0.01), "{name}");
        let is_floor = fit.points.iter().any(|point| point.excluded == Some(Exclusion::RoundOffFloor));
        assert!(!is_floor || class == Class::AtFloor, "{name}");
    }
}

#[test]
fn a_round_off_floor_is_excluded_and_marked() {
    let mut noise = Noise(5);
    for _ in 0..50 {
        let steps = noise.steps(60, 1e-2, 6.0);
        let fit = fitted(steps, |h| h * h * (0.1 + noise.uniform()) + 1e-14 * noise.normal());
        assert_eq!(fit.verdict(2.0), Verdict::Passed, "{:?}", fit.line);
        assert!(fit.points[0].excluded == Some(Exclusion::RoundOffFloor) && !fit.points[0].used);
        assert!(fit.points.iter().filter(|p| p.used).all(|p| p.step > 1e-7), "floor in the fit");
    }
}

#[test]
fn a_few_points_bent_by_round_off_do_not_decide_over_the_many_above() {
    for seed in 0..400 {
        // A tenth of the finest error is noise, and nothing levels off: an exit velocity that is nearly exact.
        let mut noise = Noise(seed);
        let steps = noise.steps(60, 1e-2, 3.0);
        let bent = fitted(steps, |h| 0.1 * h * h + 1e-12 * noise.normal());
        // Seed 141 of the suite: the exit velocity without drag, 44 times the estimated round-off at the finest step,
        // whose error is a third off.
        let mut noise = Noise(seed);
        let steps = noise.steps(60, 1.0, 3.0);
        let finest = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let off = fitted(steps, |h| 7.5e-6 * h * h * if h == finest { 1.31 } else { 1.0 + 3e-3 * noise.normal() });
        for fit in [bent, off] {
            assert_eq!(fit.verdict(2.0), Verdict::Passed, "{seed}: {:?}", fit.line);
            assert!(fit.used() >= 30, "{seed}: {} of 60", fit.used());
        }
    }
}

#[test]
fn the_fine_end_decides_between_two_orders() {
    let mut noise = Noise(7);
    let fit = fitted(noise.steps(80, 1.0, 5.0), |h| (h * h + 1e-3 * h) * (0.5 + noise.uniform()));
    assert_eq!(fit.verdict(1.0), Verdict::Passed, "{:?}", fit.line);
    assert_eq!(fit.points.last().unwrap().excluded, Some(Exclusion::PreAsymptotic));
}

#[test]
fn noise_does_not_converge() {
    let mut noise = Noise(10);
    let fits = 3_000;
    let converging =
        (0..fits).filter(|_| fitted(noise.steps(40, 1e-2, 3.0), |_| noise.normal()).class == Class::Converging).count();
    assert!(converging <= 8, "{converging} of {fits}");
}

#[test]
fn what_is_not_a_number_is_an_error_and_not_a_fit() {
    let good: Vec<_> = (1..=6).map(|i| StepError::new(f64::from(i), f64::from(i))).collect();
    let with = |point| [good.clone(), vec![point]].concat();
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(matches!(fit(&with(StepError::new(7.0, bad))), Err(FitError::NotFinite { index: 6, .. })));
        assert!(matches!(fit(&with(StepError::new(bad, 7.0))), Err(FitError::BadStep { index: 6, .. })));
    }
    assert!(matches!(fit(&with(StepError::new(0.0, 1.0))), Err(FitError::BadStep { .. })));
    assert_eq!(fit(&good[..3]), Err(FitError::TooFewSteps { found: 3, needed: 4 }));
    assert_eq!(fit(&[]), Err(FitError::TooFewSteps { found: 0, needed: 4 }));
    assert_eq!(fit(&vec![good[0]; 9]), Err(FitError::TooFewSteps { found: 1, needed: 4 }));
}

#[track_caller]
fn assert_close(values: &[f64], expected: &[f64]) {
    for (value, expected) in values.iter().zip(expected) {
        assert!((value / expected - 1.0).abs() < 1e-13, "{value:?}, not {expected:?}, in {values:?}");
    }
}

/// Errors `h^slope` on both sides of h = 1, `counts` of them and evenly spaced in ln h, `height` times their
/// round-off: the bend is at ln h = 0, halfway between two points.
fn bent(counts: [usize; 2], spacing: f64, slopes: [f64; 2], height: impl Fn(usize) -> f64) -> Vec<StepError> {
    (0..counts[0] + counts[1])
        .map(|i| {
            let x = spacing * (i as f64 - counts[0] as f64 + 0.5);
            let error = (slopes[usize::from(x > 0.0)] * x).exp();
            StepError { step: x.exp(), error, round_off: Some(error / height(i)) }
        })
        .collect()
}

/// How many of `points`, ascending in step, go for `reason`; no other reason occurs, and none is left beside them.
fn excluded_for(reason: Exclusion, points: &[StepError]) -> usize {
    let excluded = exclusions(points, &round_off(points));
    let count = excluded.iter().filter(|&&e| e == Some(reason)).count();
    assert!(excluded.iter().all(|&e| e.is_none() || e == Some(reason)), "{excluded:?}");
    let one_block = match reason {
        Exclusion::PreAsymptotic => excluded[points.len() - count..].iter().all(Option::is_some),
        _ => excluded[..count].iter().all(Option::is_some),
    };
    assert!(one_block, "{excluded:?}");
    count
}

#[test]
fn order_constant_and_their_intervals_are_those_of_the_normal_equations() {
    // The uncentred normal equations of five points and their covariance, t by the incomplete beta function: 50 digits.
    let errors = [0.5, -1.0, 3.0, -7.5, 15.0];
    let points: Vec<_> =
        [2.0, 3.0, 5.0, 7.0, 11.0].iter().zip(errors).map(|(&h, error)| StepError::new(h, error)).collect();
    let fit = fit_at_level(&points, 0.01).unwrap();
    let line = fit.line.unwrap();
    assert_close(&[line.order], &[2.068_194_788_581_501_3]);
    assert_close(&line.interval95, &[1.769_819_522_684_142_8, 2.366_570_054_478_859_7]);
    assert_close(&line.verdict_band, &[1.520_571_136_461_884_1, 2.615_818_440_701_118_4]);
    assert_close(&[line.error_constant], &[0.113_273_365_139_022_55]);
    assert_close(&fit.constant_interval.unwrap(), &[0.068_982_412_445_190_83, 0.186_001_834_309_766_05]);
}

#[test]
fn an_order_passes_only_where_its_band_holds_neither_neighbour() {
    let verdict = |class: Class, verdict_band: [f64; 2]| {
        let points: Vec<_> = (1..9).map(|i| StepError::new(f64::from(i), f64::from(i))).collect();
        let line = fit(&points).unwrap().line.map(|line| PowerLaw { verdict_band, ..line });
        OrderFit { line, constant_interval: None, class, reason: String::new(), points: Vec::new() }.verdict(2.0)
    };
    for (band, expected) in [
        ([1.5, 2.5], Verdict::Passed),
        ([2.0, 2.9], Verdict::Passed),
        ([1.1, 2.0], Verdict::Passed),
        ([1.0, 2.1], Verdict::Undecided),
        ([1.9, 3.0], Verdict::Undecided),
        ([0.5, 3.5], Verdict::Undecided),
        ([2.1, 2.9], Verdict::Failed),
        ([1.1, 1.9], Verdict::Failed),
    ] {
        assert_eq!(verdict(Class::Converging, band), expected, "{band:?}");
        let undecided = if expected == Verdict::Failed { expected } else { Verdict::Undecided };
        assert_eq!(verdict(Class::Undecided, band), undecided, "{band:?}");
        assert_eq!(verdict(Class::Diverging, band), Verdict::Failed);
        for class in [Class::Oscillating, Class::AtFloor] {
            assert_eq!(verdict(class, band), Verdict::Undecided);
        }
    }
}

#[test]
fn names_of_the_classes_are_those_in_json() {
    for class in [Class::Converging, Class::Diverging, Class::Oscillating, Class::AtFloor, Class::Undecided] {
        assert_eq!(serde_json::to_value(class).unwrap(), class.name());
    }
    assert_eq!(Class::AtFloor.name(), "at-floor");
}

#[test]
fn a_round_off_is_a_finite_size_and_may_be_zero() {
    let with = |size: f64| {
        let points: Vec<_> = (1..=6)
            .map(|i| StepError { round_off: (i == 3).then_some(size), ..StepError::new(f64::from(i), f64::from(i)) })
            .collect();
        fit(&points).map(|fit| fit.used())
    };
    assert_eq!(with(0.0), Ok(6));
    for size in [-1e-300, -1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        assert!(matches!(with(size), Err(FitError::NotFinite { index: 2, .. })), "{size}");
    }
}

#[test]
fn one_error_near_round_off_among_many_above_is_no_floor() {
    // The median decides, of 8 points and of 9: 1e-4 is 1e12 times the round-off, the one error below 100 times.
    for n in [8, 9] {
        let points: Vec<_> = (1..=n)
            .map(|i| StepError { step: f64::from(i), error: if i == 5 { 1e-14 } else { 1e-4 }, round_off: Some(1e-16) })
            .collect();
        let fit = fit(&points).unwrap();
        assert_eq!((fit.class, fit.used()), (Class::Undecided, points.len()), "{}", fit.reason);
    }
}

#[test]
fn an_event_at_the_end_of_a_step_by_chance_is_round_off_wherever_it_stands() {
    let used = |place: usize, error: f64| {
        let points: Vec<_> = (1..=20)
            .map(|i| StepError::new(f64::from(i), if i as usize == place { error } else { 1e-3 * f64::from(i) }))
            .collect();
        fit(&points).unwrap().used()
    };
    for place in [1, 10, 20] {
        assert_eq!(used(place, -3e-16), 19, "{place}");
    }
    // A change of sign comes near zero, not to within round-off of it.
    assert_eq!(used(10, 3e-8), 20);
}

#[test]
fn noisy_points_go_up_to_half_of_all_and_beyond_that_pure_round_off_alone() {
    let run = |heights: [f64; 8]| {
        let point = |(i, height): (usize, f64)| StepError {
            step: 1.0 + i as f64,
            error: if i % 2 == 0 { height } else { -height },
            round_off: Some(1.0),
        };
        let points: Vec<_> = heights.into_iter().enumerate().map(point).collect();
        excluded_for(Exclusion::RoundOffFloor, &points)
    };
    let high = 1e6;
    assert_eq!(run([50.0, 4.0, 9.0, 100.0, high, high, high, high]), 4);
    assert_eq!(run([50.0, 4.0, 9.0, 100.1, high, high, high, high]), 3);
    assert_eq!(run([50.0, 4.0, 9.0, 100.0, 7.0, high, high, high]), 0);
    assert_eq!(run([3.0, 1.0, 0.5, 3.0, 3.0, 3.1, high, high]), 5);
}

#[test]
fn a_floor_goes_with_the_points_where_it_is_a_quarter_of_the_trend() {
    // Above the bend the floor's share falls as h^-(coarse - fine): to 1/4 at ln h = ln 4/(coarse - fine).
    let floor = |slopes| excluded_for(Exclusion::RoundOffFloor, &bent([17, 17], 0.1, slopes, |_| 300.0));
    // Round-off that grows as steps are added: 0.4621, beyond 5 points.
    assert_eq!(floor([-1.0, 2.0]), 17 + 5);
    // 0.9242, beyond 9 points.
    assert_eq!(floor([0.5, 2.0]), 17 + 9);
    // The fine side falls at more than half the slope of the trend: no floor, and it goes alone.
    assert_eq!(floor([1.2, 2.0]), 17);
}

#[test]
fn the_law_of_the_coarse_end_goes_where_it_is_a_tenth_or_in_half_of_the_fine_side() {
    let coarse = |slopes| excluded_for(Exclusion::PreAsymptotic, &bent([24, 10], 0.1, slopes, |_| 1e6));
    // Its share falls to 1/10 at ln h = -ln 10/3 = -0.7675, 8 points below the bend.
    assert_eq!(coarse([1.0, 4.0]), 10 + 8);
    assert_eq!(coarse([4.0, 1.0]), 10 + 8);
    // -ln 10/0.5 = -4.6 is beyond the finest step: of the 24 points below the bend the lower half and the next one stay.
    assert_eq!(coarse([1.0, 1.5]), 10 + 11);
}

#[test]
fn the_median_above_round_off_separates_a_floor_from_another_law() {
    // Of the 24 points below the bend k are 10 times their round-off, the others 1e6 times.
    let points = |k: usize| bent([24, 10], 0.1, [1.0, 4.0], |i| if (1..=k).contains(&i) { 10.0 } else { 1e6 });
    assert_eq!(excluded_for(Exclusion::PreAsymptotic, &points(12)), 10 + 8);
    // ln 4/3 = 0.4621 above the bend: 5 points.
    assert_eq!(excluded_for(Exclusion::RoundOffFloor, &points(13)), 24 + 5);
}

#[test]
fn what_is_left_of_too_few_points_says_so() {
    let of = |errors: &[f64]| {
        let point = |(i, &error): (usize, &f64)| StepError { step: 1.0 + i as f64, error, round_off: Some(1.0) };
        let fit = fit(&errors.iter().enumerate().map(point).collect::<Vec<_>>()).unwrap();
        assert_eq!((fit.line, fit.used(), fit.verdict(1.0)), (None, 0, Verdict::Undecided));
        (fit.class, fit.reason)
    };
    // Three zeros and two errors of the size of their round-off.
    let floor = (Class::AtFloor, "5 of 8 errors are zero or round-off".to_owned());
    assert_eq!(of(&[0.0, 1.0, 0.0, -1.0, 0.0, 1e6, 2e6, 3e6]), floor);
    // Of five points below a bend two are left to the law above it, and three make no line.
    let bend = fit(&bent([5, 5], 0.1, [1.0, 1.5], |_| 1e6)).unwrap();
    assert_eq!((bend.line, bend.class), (None, Class::Undecided));
    assert_eq!(bend.reason, "3 points are too few");
}

#[test]
fn a_slope_no_larger_than_the_resolution_is_not_distinguished_from_zero() {
    // Without noise the half-width is ORDER_RESOLUTION: 0.05 - 0.05 = 0 is not above zero, nor -0.05 + 0.05 below.
    let class = |slope: f64| {
        let x = [-2.0, -1.0, 1.0, 2.0];
        classify(&x, &x.map(|x| slope * x), &[false; 4], 1e9, &[None; 4]).0
    };
    for (slope, expected) in [
        (ORDER_RESOLUTION, Class::Undecided),
        (-ORDER_RESOLUTION, Class::Undecided),
        (0.0, Class::Undecided),
        (0.051, Class::Converging),
        (-0.051, Class::Diverging),
    ] {
        assert_eq!(class(slope), expected, "{slope}");
    }
}

#[test]
fn steps_alike_to_ten_digits_show_no_slope() {
    // Standard deviation of ln h on either side of 1e-10, for four points and for forty.
    for n in [4, 40] {
        let y: Vec<f64> = (0..n).map(f64::from).collect();
        let has_slope = |sigma: f64| {
            let x: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { sigma } else { -sigma }).collect();
            line(&x, &y).is_some()
        };
        assert!(!has_slope(0.0) && !has_slope(0.99e-10) && has_slope(1.01e-10), "{n}");
    }
    let steps = [1.0, 1.0_f64.next_up(), 1.0 + 2.0 * f64::EPSILON, 1.0 + 3.0 * f64::EPSILON];
    let fit = fit(&steps.map(|h| StepError::new(h, h))).unwrap();
    assert_eq!((fit.line, fit.class, fit.used()), (None, Class::Undecided, 0));
    assert_eq!(fit.reason, "the steps are too much alike to show a slope");
}

#[test]
fn a_bend_is_the_least_squares_one_with_the_tail_of_its_f() {
    // Ten points leave one place, between the fifth and the sixth. Slopes and sums by the normal equations in 40 digits.
    let x = [0.0, 1.0, 3.0, 4.0, 6.0, 9.0, 10.0, 12.0, 15.0, 16.0];
    let y = [0.0, 2.0, 3.0, 4.0, 7.0, 9.0, 12.0, 18.0, 27.0, 28.0];
    let (tail, bend) = best_bend(&x, &y).unwrap();
    assert_eq!(bend.at, 7.5);
    assert_close(&[bend.fine_slope], &[0.740_037_695_207_323_6]);
    assert_close(&[bend.coarse_slope], &[0.740_037_695_207_323_6 + 1.861_066_235_864_297_3]);
    // (7.8160/58.757)^3
    assert!((tail / 0.002_353_811_879_770_368_3 - 1.0).abs() < 1e-12, "{tail}");
    assert!(best_bend(&x[1..], &y[1..]).is_none());
}

#[test]
fn a_bend_of_steps_of_any_size_is_as_sharp() {
    for (base, n) in [(-690.0, 10), (-690.0, 34), (690.0, 34), (0.0, 34)] {
        let x: Vec<f64> = (0..n).map(|i| base + 0.1 * f64::from(i)).collect();
        let middle = x.len() / 2;
        let at = 0.5 * (x[middle - 1] + x[middle]);
        let y: Vec<f64> = x.iter().map(|x| (x - at) + 2.0 * (x - at).max(0.0)).collect();
        let (_, bend) = best_bend(&x, &y).unwrap();
        assert_eq!(bend.at, at);
        assert!((bend.fine_slope - 1.0).abs() < 1e-12 && (bend.coarse_slope - 3.0).abs() < 1e-12, "{bend:?}");
    }
}

#[test]
fn an_eighth_of_the_points_stays_on_either_side_of_a_bend() {
    // 80 points and a kink behind 7 of them, from either end: the nearest place looked at is behind 10.
    let x: Vec<f64> = (0..80).map(f64::from).collect();
    for (kink, nearest) in [(6.5, 9.5), (72.5, 69.5)] {
        let y: Vec<f64> = x.iter().map(|x| (x - kink).max(0.0)).collect();
        assert_eq!(best_bend(&x, &y).unwrap().1.at, nearest);
    }
}

#[test]
fn slopes_that_meet_a_limit_exactly_are_on_its_near_side() {
    // Fits whose slopes stand at a limit to the last bit; rounding makes a part of these lines such.
    let (mut flat, mut half, mut tenth) = (0, 0, 0);
    for k in 0..300 {
        let spacing = 0.1 + 1e-3 * f64::from(k);
        let fitted = |slopes: [f64; 2], height: f64| {
            let points = bent([9, 9], spacing, slopes, |_| height);
            let x: Vec<f64> = points.iter().map(|point| point.step.ln()).collect();
            let y: Vec<f64> = points.iter().map(|point| point.error.ln()).collect();
            (best_bend(&x, &y).unwrap(), bend(&x, &y).is_some(), points)
        };
        // A coarse end that does not fall is no trend that a floor could end.
        let ((_, bend), _, points) = fitted([1.0, 0.0], 300.0);
        if bend.coarse_slope == 0.0 {
            flat += 1;
            assert!(excluded_for(Exclusion::PreAsymptotic, &points) >= 9);
        }
        // At half the slope of the trend the fine side is not flat, and goes alone.
        let ((_, bend), _, points) = fitted([1.0, 2.0], 300.0);
        if bend.fine_slope == 0.5 * bend.coarse_slope {
            half += 1;
            assert_eq!(excluded_for(Exclusion::RoundOffFloor, &points), 9);
        }
        // Slopes a tenth apart are one line.
        let ((tail, bend), bends, _) = fitted([0.0, BEND_MIN], 1e6);
        if bend.coarse_slope - bend.fine_slope == BEND_MIN {
            tenth += 1;
            assert!(tail < BEND_LEVEL && !bends);
        }
    }
    assert!(flat > 0 && half > 0 && tenth > 0, "{flat} {half} {tenth}");
}

#[test]
fn zero_is_exceeded_with_certainty() {
    for dof in [1, 2, 58] {
        let t = student_t(1.0, dof);
        assert!((0.0..1e-18).contains(&t), "{t:e}");
    }
}
