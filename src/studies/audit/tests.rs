#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]
use std::fmt::Write;

mod random_tables;

use super::*;
use crate::studies::order::noise::Noise;
use crate::studies::order::{Class, Exclusion};
use crate::studies::quantity::Quantity;

/// A depth table; `f` of the step in units of the coarsest.
fn table(rows: i32, mut f: impl FnMut(f64, i32) -> f64) -> String {
    let mut text = "dt_s,depth_m\n".to_owned();
    for i in 0..rows {
        let h = 0.5_f64.powi(i);
        writeln!(text, "{},{}", 1e-5 * h, f(h, i)).unwrap();
    }
    text
}

fn judge_text(text: &str, order: Option<f64>, exact: Option<f64>) -> Audit {
    let exact = exact.map(|depth| {
        let mut values = [Exact::Unknown; Quantity::ALL.len()];
        values[Quantity::Depth as usize] = Exact::Free(depth);
        ExactValues { impact_velocity: 300.0, stops: true, values, ..ExactValues::default() }
    });
    let table = Table::read("run.csv", text.as_bytes()).unwrap();
    audit(&table, &FormalOrders::of_all(order), exact.as_ref(), None).unwrap()
}

fn kinds(audit: &Audit) -> Vec<FindingKind> {
    audit.findings.iter().map(|finding| finding.kind).collect()
}

const BASE: &str = "1e-6,1.01\n2e-6,1.04\n4e-6,1.16\n8e-6,1.64\n";

#[test]
fn clean_tables_of_either_order_pass_from_four_rows_on_with_and_without_an_exact_value() {
    for rows in 4..=8 {
        for order in [1.0, 2.0] {
            // A next term of 10 %, and seven digits as Abaqus prints them.
            let text = table(rows, |h, _| {
                let term = h.powf(order);
                ((5.0 + 0.1 * term * (1.0 + 0.1 * term)) * 1e6).round() / 1e6
            });
            for exact in [None, Some(5.0)] {
                let audit = judge_text(&text, Some(order), exact);
                assert_eq!(
                    audit.verdict,
                    Verdict::Passed,
                    "{rows} rows, order {order}, {exact:?}: {:?}",
                    audit.findings
                );
                assert_ne!(
                    judge_text(&text, Some(3.0 - order), exact).verdict,
                    Verdict::Passed,
                    "{rows} rows, order {order}"
                );
                assert_eq!(judge_text(&text, None, exact).verdict, Verdict::Passed);
            }
        }
    }
}

#[test]
fn noisy_tables_of_twelve_rows_pass_and_miss_the_other_order() {
    let mut noise = Noise(11);
    for _ in 0..20 {
        for order in [1.0, 2.0] {
            let deviations: Vec<f64> = (0..12).map(|_| 1.0 + 0.05 * noise.normal()).collect();
            let text = table(12, |h, i| 0.17 + 0.01 * h.powf(order) * deviations[i as usize]);
            for exact in [None, Some(0.17)] {
                let audit = judge_text(&text, Some(order), exact);
                assert_eq!(audit.verdict, Verdict::Passed, "order {order}, {exact:?}: {:?}", audit.findings);
                let missed = judge_text(&text, Some(3.0 - order), exact);
                assert_eq!(missed.verdict, Verdict::Failed);
                assert_eq!(kinds(&missed), [FindingKind::OrderMissed]);
            }
        }
    }
}

#[test]
fn a_diverging_table_fails_where_its_reverse_passes() {
    assert_eq!(judge_text(&format!("dt_s,depth_m\n{BASE}"), Some(2.0), None).verdict, Verdict::Passed);
    let text = "dt_s,depth_m\n8e-6,1.01\n4e-6,1.04\n2e-6,1.16\n1e-6,1.64\n";
    for (order, exact) in [(None, None), (Some(2.0), None), (None, Some(1.0)), (Some(2.0), Some(1.0))] {
        let audit = judge_text(text, order, exact);
        assert_eq!((audit.verdict, audit.quantities[0].class), (Verdict::Failed, Class::Diverging));
        assert_eq!(kinds(&audit), [FindingKind::Diverging]);
        assert!(audit.quantities[0].error_bands.is_empty(), "no error bar for what diverges");
    }
}

#[test]
fn an_oscillating_table_fails_even_where_its_amplitude_falls() {
    for decay in [0.0, 0.81, 2.0, -0.5] {
        let text = table(6, |h, i| 1.0 + 0.1 * h.powf(decay) * f64::from(1 - 2 * (i % 2)));
        for exact in [None, Some(1.0)] {
            let audit = judge_text(&text, None, exact);
            assert_eq!(audit.verdict, Verdict::Failed, "decay {decay}, {exact:?}: {:?}", audit.findings);
            assert!(matches!(kinds(&audit)[0], FindingKind::Oscillating | FindingKind::Diverging));
        }
    }
}

#[test]
fn constants_and_zero_errors_are_undecided() {
    let text = table(6, |_, _| 0.173);
    let audit = judge_text(&text, Some(2.0), None);
    assert_eq!((audit.verdict, kinds(&audit)), (Verdict::Undecided, vec![FindingKind::Constant]));
    let audit = judge_text(&text, Some(2.0), Some(0.173));
    assert_eq!((audit.verdict, kinds(&audit)), (Verdict::Undecided, vec![FindingKind::ZeroError]));
    let audit = judge_text(&text, Some(2.0), Some(0.2));
    assert_eq!(audit.verdict, Verdict::Failed, "a constant that is not the exact value");
}

#[test]
fn noise_passes_in_fewer_than_one_table_of_a_thousand() {
    // Of 10^4 tables a size, as PENETRODE_NOISE_TABLES=10000 judges them: at most 9 pass at four rows, 5 at five, 1 at
    // twenty, none at eight. The few judged by default only see a rule that has come loose.
    let count: usize = std::env::var("PENETRODE_NOISE_TABLES").ok().and_then(|n| n.parse().ok()).unwrap_or(25);
    let mut noise = Noise(5);
    let mut passed = [[0; 4]; 4];
    for (size, rows) in [4, 5, 8, 20].into_iter().enumerate() {
        for _ in 0..count {
            let values: Vec<f64> = (0..rows).map(|_| 5.0 + 0.1 * noise.normal()).collect();
            let text = table(rows, |_, i| values[i as usize]);
            let cases = [(Some(1.0), None), (Some(2.0), None), (Some(2.0), Some(5.0)), (None, None)];
            for (case, (order, exact)) in cases.into_iter().enumerate() {
                passed[size][case] += usize::from(judge_text(&text, order, exact).verdict == Verdict::Passed);
            }
        }
    }
    println!("{count} tables of 4, 5, 8, 20 rows; order 1, order 2, order 2 against exact, no order: {passed:?}");
    for case in 0..3 {
        let all: usize = passed.iter().map(|size| size[case]).sum();
        assert!(1000 * all <= 4 * count + 2000, "{all} of {} tables of noise pass, case {case}", 4 * count);
    }
}

#[test]
fn convergence_to_something_else_than_the_exact_value_fails() {
    let text = table(7, |h, _| 1.01 + 0.1 * h * h);
    assert_eq!(judge_text(&text, Some(2.0), None).verdict, Verdict::Passed);
    let audit = judge_text(&text, None, Some(1.0));
    assert_eq!(audit.verdict, Verdict::Failed);
    assert!(kinds(&audit).contains(&FindingKind::WrongLimit), "{:?}", audit.findings);
}

#[test]
fn rows_that_differ_from_the_exact_value_by_their_printed_digits_only_are_left_out() {
    let text = table(9, |h, _| ((0.173_214_1 + 0.02 * h * h) * 1e6).round() / 1e6);
    let audit = judge_text(&text, Some(2.0), Some(0.173_214_1));
    assert_eq!(audit.verdict, Verdict::Passed, "{:?}", audit.findings);
    let finest = audit.quantities[0].points[0];
    assert_eq!((finest.used, finest.excluded), (false, Some(Exclusion::RoundOffFloor)));
}

fn exact(quantity: Quantity, value: Exact, stops: bool) -> ExactValues {
    let mut values = [Exact::Unknown; Quantity::ALL.len()];
    values[quantity as usize] = value;
    ExactValues { impact_velocity: 300.0, stops, values, ..ExactValues::default() }
}

fn judge_against(text: &str, order: Option<f64>, exact: &ExactValues) -> Audit {
    let table = Table::read("run.csv", text.as_bytes()).unwrap();
    audit(&table, &FormalOrders::of_all(order), Some(exact), None).unwrap()
}

#[test]
fn a_code_of_another_outcome_fails_and_the_outcome_is_named() {
    let leaves = "dt_s,velocity_m_s\n4e-6,136\n2e-6,135.5\n1e-6,135.25\n5e-7,135.125\n";
    let at_rest = exact(Quantity::Velocity, Exact::Fixed(0.0), true);
    let stays = "dt_s,depth_m\n4e-6,0.14500\n2e-6,0.14490\n1e-6,0.14485\n5e-7,0.144825\n";
    let perforated = exact(Quantity::Depth, Exact::Fixed(0.18), false);
    for (text, exact, named) in [
        (leaves, at_rest, "it leaves where the projectile of the scene comes to rest"),
        (stays, perforated, "(-19.56 %): it comes to rest where the scene is perforated"),
    ] {
        for order in [None, Some(1.0)] {
            let audit = judge_against(text, order, &exact);
            assert_eq!(audit.verdict, Verdict::Failed);
            assert!(audit.quantities[0].reason.ends_with(named), "{}", audit.quantities[0].reason);
            assert!(kinds(&audit).contains(&FindingKind::WrongLimit) && audit.quantities[0].error_band.is_some());
        }
    }
}

#[test]
fn a_quantity_that_the_scene_does_not_have_fails() {
    let exact = exact(Quantity::CraterEndTime, Exact::Absent("the projectile does not reach x = k d"), true);
    let text = "dt_s,crater_end_time_s\n4e-6,0.0014\n2e-6,0.00139\n1e-6,0.001385\n5e-7,0.0013825\n";
    let audit = judge_against(text, None, &exact);
    assert_eq!((audit.verdict, kinds(&audit)), (Verdict::Failed, vec![FindingKind::Absent]));
}

#[test]
fn what_the_scene_fixes_passes_when_every_row_has_it_and_is_judged_as_others_when_not() {
    let perforated = exact(Quantity::Depth, Exact::Fixed(0.18), false);
    let audit = judge_against(&table(5, |_, _| 0.18), Some(1.0), &perforated);
    assert_eq!((audit.verdict, audit.quantities[0].fixed), (Verdict::Passed, true));
    // A code that ends the step beyond the far side approaches it.
    assert_eq!(judge_against(&table(8, |h, _| 0.18 + 0.01 * h), Some(1.0), &perforated).verdict, Verdict::Passed);
    assert_eq!(judge_against(&table(5, |_, _| 0.1801), None, &perforated).verdict, Verdict::Failed);
}

#[test]
fn the_order_of_a_mixture_is_that_of_the_finest_steps() {
    const LIMIT: f64 = 5.0 / 3.0;
    // f0 + 20 h + D h²: the first order is seen whichever term is larger at the coarse steps.
    for (rows, ratio, crossover) in [(5, 2.0, 4.0), (6, 2.0, 2.5), (12, 1.5, 64.0), (8, 2.0, -3.0)] {
        let mut text = "dt_s,depth_m\n".to_owned();
        for i in 0..rows {
            let h = 1e-6 * f64::powi(ratio, i);
            writeln!(text, "{h},{}", LIMIT + 20.0 * h * (1.0 + h / (1e-6 * crossover))).unwrap();
        }
        for exact in [None, Some(LIMIT)] {
            let first = judge_text(&text, Some(1.0), exact);
            assert_eq!(first.verdict, Verdict::Passed, "{rows} rows, {exact:?}: {:?}", first.findings);
            let term = first.quantities[0].second_term.unwrap();
            assert!((term.crossover / (1e-6 * crossover) - 1.0_f64.copysign(crossover)).abs() < 0.05, "{term:?}");
            assert_ne!(judge_text(&text, Some(2.0), exact).verdict, Verdict::Passed, "{rows} rows, {exact:?}");
        }
    }
}

#[test]
fn four_rows_whose_order_drifts_pass_no_order() {
    let text = table(4, |h, _| 5.0 + 0.1 * h * (1.0 + 4.0 * h));
    for order in [1.0, 2.0] {
        let audit = judge_text(&text, Some(order), None);
        assert_eq!(audit.verdict, Verdict::Undecided, "order {order}: {:?}", audit.quantities[0].reason);
        assert!(audit.quantities[0].advice.is_some());
    }
}

#[test]
fn three_rows_pass_within_a_tenth_of_the_formal_order_and_two_have_an_error_bar() {
    let text = table(3, |h, _| 5.0 + 0.1 * h * (1.0 + 0.1 * h));
    let verdict = |order| judge_text(&text, order, None).verdict;
    assert_eq!(verdict(Some(1.0)), Verdict::Passed);
    assert_eq!((verdict(Some(2.0)), verdict(None)), (Verdict::Undecided, Verdict::Undecided));
    assert_eq!(judge_text(&text, None, Some(5.0)).verdict, Verdict::Passed, "each pair has an order of its own");
    let audit = judge_text(&table(2, |h, _| 5.0 + 0.1 * h), Some(1.0), None);
    let half_width = audit.quantities[0].error_band.unwrap().half_width;
    assert!((half_width - 3.0 * 0.05).abs() < 1e-12 && audit.verdict == Verdict::Undecided, "{half_width}");
    let two = Table::read("run.csv", table(2, |h, _| h).as_bytes()).unwrap();
    let refused = audit_error(&two, None);
    assert_eq!(refused, "run.csv: 2 different steps, and an order needs 3");
}

fn audit_error(table: &Table, order: Option<f64>) -> String {
    audit(table, &FormalOrders::of_all(order), None, None).unwrap_err().to_string()
}

#[test]
fn the_unit_of_the_values_changes_no_judgement() {
    let scaled = |scale: f64| judge_text(&table(6, |h, _| scale * (5.0 + 0.1 * h * h)), Some(2.0), None);
    for scale in [1.0, 1e200, 1e-160, -1e160] {
        let audit = scaled(scale);
        assert_eq!(audit.verdict, Verdict::Passed, "{scale}: {:?}", audit.findings);
        let band = audit.quantities[0].error_band.unwrap().half_width / scale.abs();
        assert!((band - scaled(1.0).quantities[0].error_band.unwrap().half_width).abs() < 1e-6, "{scale}: {band}");
    }
}

#[test]
fn each_column_may_have_an_order_of_its_own() {
    let mut text = "dt_s,depth_m,time_s\n".to_owned();
    for i in 0..6 {
        let h = 0.5_f64.powi(i);
        writeln!(text, "{},{},{}", 1e-5 * h, 5.0 + 0.1 * h * h, 2.0 + 0.1 * h).unwrap();
    }
    let table = Table::read("run.csv", text.as_bytes()).unwrap();
    let verdict = |orders: &str| audit(&table, &orders.parse().unwrap(), None, None).unwrap().verdict;
    assert_eq!(verdict("depth=2,time=1"), Verdict::Passed);
    assert_eq!(verdict("1,depth=2"), Verdict::Passed);
    assert_eq!(verdict("2"), Verdict::Failed);
    assert_eq!("depth=x".parse::<FormalOrders>(), Err("`x` is not a number".to_owned()));
    let error = audit(&table, &"velocity=1".parse().unwrap(), None, None).unwrap_err();
    assert_eq!(error.to_string(), "an order is given for `velocity`, and the columns are depth, time");
}

#[test]
fn the_error_bar_of_the_headline_covers_nineteen_tables_of_twenty() {
    // Share of tables whose limit lies within the bar of the finest value, and the median of bar over error.
    let mut noise = Noise(3);
    for (kind, rows) in [("order", 6), ("noise", 6), ("rounded", 6), ("mixture", 6), ("saw-tooth", 8)] {
        let (count, mut covered, mut widths) = (200, 0, Vec::new());
        for _ in 0..count {
            let (next, share) = (0.2 * noise.normal(), 0.5 + noise.uniform());
            let text = table(rows, |h, _| {
                let value = match kind {
                    "mixture" => h * (1.0 + h / share),
                    "saw-tooth" => h * (2.0 * noise.uniform() - 1.0),
                    "noise" => h * (1.0 + next * h) + 0.02 * noise.normal(),
                    _ => h * (1.0 + next * h),
                };
                let value = 5.0 + 0.1 * value;
                if kind == "rounded" { (value * 1e4).round() / 1e4 } else { value }
            });
            let audit = judge_text(&text, None, None);
            let (finest, band) = (audit.quantities[0].finest.value, audit.quantities[0].error_band);
            let band = band.unwrap();
            covered += usize::from((finest - 5.0).abs() <= band.half_width);
            widths.push(band.half_width / (finest - 5.0).abs());
        }
        widths.sort_by(f64::total_cmp);
        assert!(10 * covered >= 9 * count, "{kind}: {covered} of {count}");
        assert!(widths[count / 2] <= 5.0, "{kind}: {}", widths[count / 2]);
    }
}

#[test]
fn a_limit_that_is_missed_by_little_does_not_pass_as_a_lower_order() {
    // Central difference on a slab of 0.1 % less density: towards 134.921 and not 135.009 m/s.
    let velocities = "dt_s,velocity_m_s\n1.6e-05,133.340364\n8e-06,134.133081\n4e-06,134.517912\n2e-06,134.718008\n\
                      1e-06,134.818929\n";
    let velocity = exact(Quantity::Velocity, Exact::Free(135.008_9), false);
    // First order towards 0.181803 and not 0.18.
    let mut depths = "dt_s,depth_m\n".to_owned();
    for i in 0..6 {
        let h = 1.5_f64.powi(-i);
        writeln!(depths, "{},{}", 1e-7 * h, 0.181_803 - 0.0223 * h).unwrap();
    }
    let depth = exact(Quantity::Depth, Exact::Free(0.18), true);
    for (text, exact) in [(velocities, velocity), (depths.as_str(), depth)] {
        for order in [None, Some(1.0)] {
            assert_ne!(judge_against(text, order, &exact).verdict, Verdict::Passed, "{order:?}");
        }
    }
}

#[test]
fn a_limit_that_clean_rows_tell_from_the_exact_value_does_not_pass() {
    // First order towards 1e-5 beside the exact depth: 2 % of the finest error, and 3,000 times the printed digits.
    let exact = 0.144_826_200_112_217_06;
    for (beside, verdict) in [(0.0, Verdict::Passed), (1e-5, Verdict::Undecided), (-1e-5, Verdict::Undecided)] {
        let text = table(6, |h, _| ((exact * (1.0 - beside) + 2.64e-3 * h) * 1e9).round() / 1e9);
        let audit = judge_text(&text, None, Some(exact));
        assert_eq!(audit.verdict, verdict, "{beside}: {}", audit.quantities[0].reason);
    }
}

#[test]
fn rows_at_round_off_bend_no_law() {
    let text = table(20, |h, _| 5.0 / 3.0 + 0.1 * h.powi(4) * (1.0 + 0.3 * h));
    let verdict = |order| judge_text(&text, Some(order), None).verdict;
    assert_eq!(verdict(4.0), Verdict::Passed);
    assert!(verdict(3.0) != Verdict::Passed && verdict(2.0) != Verdict::Passed);
}

#[test]
fn a_law_of_two_terms_passes_only_an_order_within_its_interval() {
    // Order 4 and a little noise, which h^3.1 beside h^4.1 follows.
    let text = "dt_s,depth_m\n0.000463644,0.322785471698701\n0.000927288,0.3227854689907127\n\
                0.00185458,0.32278541075363143\n0.00370915,0.3227845062195921\n0.00741831,0.3227698169504584\n\
                0.0148366,0.3225248513788802\n";
    assert_ne!(judge_text(text, Some(3.0), None).verdict, Verdict::Passed);
}

#[test]
fn values_that_scatter_seldom_fail() {
    let mut noise = Noise(8);
    let mut failed = [0; 4];
    for (count, rows) in failed.iter_mut().zip([3, 4, 6, 8]) {
        for _ in 0..40 {
            let text = table(rows, |h, _| 5.0 + 0.1 * h * (2.0 * noise.uniform() - 1.0));
            let audit = judge_text(&text, Some(1.0), None);
            *count += usize::from(audit.verdict == Verdict::Failed);
            let said = format!("{:?}", (&audit.quantities[0].reason, &audit.quantities[0].advice));
            assert!(!said.contains("NaN") && !said.contains("inf"), "{said}");
        }
    }
    assert!(failed.iter().sum::<usize>() <= 16, "{failed:?} of 40 each");
}

#[test]
fn a_scheme_that_reproduces_depths_and_times_vouches_for_no_velocity_at_rest() {
    use crate::integrators::{Boundaries, CentralDifference, Detail, Integrator, VelocityAt};
    use crate::studies::scheme_of_table::identify;
    let problem = crate::testing::scene().problem().unwrap();
    let scheme = |step| {
        let scheme = CentralDifference::uniform(step, VelocityAt::default(), Boundaries::Interpolated);
        scheme.solve(&problem, Detail::Events).unwrap()
    };
    let rest = scheme(1e-6).end;
    assert_eq!(rest.velocity, 0.0);
    let mut text = "dt_s,depth_m,time_s,velocity_m_s\n".to_owned();
    for step in [4e-6, 2e-6, 1e-6, 5e-7] {
        let end = scheme(step).end;
        writeln!(text, "{step},{},{},10.0000", end.depth, end.time).unwrap();
    }
    let mut exact = exact(Quantity::Depth, Exact::Free(rest.depth), true);
    exact.values[Quantity::Time as usize] = Exact::Free(rest.time);
    exact.values[Quantity::Velocity as usize] = Exact::Fixed(0.0);
    let table = Table::read("run.csv", text.as_bytes()).unwrap();
    let found = identify(&problem, &table);
    assert!(found.as_ref().is_some_and(|found| !found.candidates.is_empty()));
    let audit = audit(&table, &FormalOrders::default(), Some(&exact), found).unwrap();
    let verdicts: Vec<Verdict> = audit.quantities.iter().map(|column| column.verdict).collect();
    assert_eq!(verdicts, [Verdict::Passed, Verdict::Passed, Verdict::Failed]);
}

#[test]
fn times_at_the_ends_of_steps_have_a_bar_of_a_step_although_they_agree() {
    for (name, least) in [("time_s", 6.25e-7), ("depth_m", 0.0)] {
        let rows = "1e-5,0.00127\n5e-6,0.00127\n2.5e-6,0.00127\n1.25e-6,0.00127\n6.25e-7,0.001270000\n";
        let audit = judge_text(&format!("dt_s,{name}\n{rows}"), Some(1.0), None);
        let band = audit.quantities[0].error_band.unwrap().half_width;
        assert!(band >= least && (least > 0.0 || band < 1e-8), "{name}: {band:e}");
    }
}

#[test]
fn a_column_that_counts_steps_is_left_out_and_no_other_one() {
    let mut text = "dt_s,depth_m,steps,peak\n".to_owned();
    for (i, steps) in [64, 127, 254, 508, 1015].into_iter().enumerate() {
        let h = 0.5_f64.powi(i as i32);
        writeln!(text, "{},{},{steps},{}", 1e-5 * h, 5.0 + 0.1 * h, 700 + (1000.0 * h) as i32).unwrap();
    }
    let audit = judge_text(&text, Some(1.0), None);
    assert_eq!(kinds(&audit)[0], FindingKind::StepCount);
    let names: Vec<&str> = audit.quantities.iter().map(|column| column.quantity.name()).collect();
    assert_eq!((names, audit.quantities[0].verdict), (vec!["depth", "peak"], Verdict::Passed));
}

#[test]
fn three_rows_that_run_away_are_undecided_with_a_bar_and_a_fourth_makes_them_fail() {
    let rows = "8e-6,1.01\n4e-6,1.04\n2e-6,1.16\n";
    let audit = judge_text(&format!("dt_s,depth_m\n{rows}"), Some(2.0), None);
    assert_eq!((audit.verdict, kinds(&audit)), (Verdict::Undecided, vec![FindingKind::Diverging]));
    assert!(audit.quantities[0].error_band.is_some() && audit.quantities[0].advice.is_some());
    assert_eq!(judge_text(&format!("dt_s,depth_m\n{rows}1e-6,1.64\n"), Some(2.0), None).verdict, Verdict::Failed);
}

#[test]
fn an_order_that_the_finest_rows_exclude_never_passes_as_a_law_of_two_terms() {
    // The classical Runge-Kutta scheme: the finest rows show 3.99, and h^4.98 beside h^6.98 follows all of them.
    let text =
        table(6, |_, i| [9.333_9e-8, 2.973_1e-7, 2.792_5e-6, 1.643_2e-4, -1.458_7e-2, -1.0][5 - i as usize] + 3.0);
    let steps = [28.5, 17.1, 6.84, 2.342, 1.336, 1.0];
    let text = text.lines().skip(1).zip(steps).fold("dt_s,depth_m\n".to_owned(), |all, (line, step)| {
        format!("{all}{step}e-6,{}\n", line.split(',').nth(1).unwrap())
    });
    assert_ne!(judge_text(&text, Some(5.0), None).verdict, Verdict::Passed);
}

/// Few digits make the band of the verdict wide, and a law of two terms its interval.
#[test]
fn an_order_far_from_the_interval_that_is_printed_never_passes() {
    let rounded = |digits: i32, order: f64, ratio: f64, rows: i32| {
        let mut text = "dt_s,q\n".to_owned();
        for i in 0..rows {
            let h = 0.4 / ratio.powi(i);
            let unit = 10_f64.powi(digits);
            writeln!(text, "{h:.12},{}", ((120.0 + 43.0 * h.powf(order)) * unit).round() / unit).unwrap();
        }
        text
    };
    let softened = |claim: f64| {
        let text = table(8, |h, _| 7.0 + 0.2 * h + 0.027 * h.powf(1.5));
        judge_text(&text, Some(claim), None).verdict
    };
    for (text, order, others) in [
        (rounded(2, 2.0, 1.5, 6), 2.0, [1.5, 2.5]),
        (rounded(2, 1.0, 1.5, 6), 1.0, [0.5, 1.5]),
        (rounded(3, 1.5, 2.0, 7), 1.5, [1.0, 2.0]),
    ] {
        assert_eq!(judge_text(&text, Some(order), None).verdict, Verdict::Passed, "{order}");
        for other in others {
            assert_ne!(judge_text(&text, Some(other), None).verdict, Verdict::Passed, "{order} as {other}");
        }
    }
    assert_ne!(softened(0.25), Verdict::Passed);
    assert_ne!(softened(0.5), Verdict::Passed);
}

/// A row that was not solved again, a solver that stops getting nearer, a row of something else.
#[test]
fn a_finest_value_off_the_law_of_the_others_does_not_pass() {
    let value = |h: f64| 7.0 + 0.4 * h * h;
    for rows in [6, 8, 10] {
        let right = table(rows, |h, _| value(h));
        assert_eq!(judge_text(&right, Some(2.0), None).verdict, Verdict::Passed);
        let finest = 0.5_f64.powi(rows - 1);
        let change = value(2.0 * finest) - value(finest);
        for (wrong, kind) in [
            (table(rows, |h, i| value(if i == rows - 1 { 2.0 * h } else { h })), "stale"),
            (table(rows, |h, _| value(h.max(4.0 * finest))), "at a floor"),
            (table(rows, |h, i| value(h) - if i == rows - 1 { 20.0 * change } else { 0.0 }), "of something else"),
        ] {
            for order in [Some(2.0), None] {
                let audit = judge_text(&wrong, order, None);
                assert_eq!(audit.verdict, Verdict::Undecided, "{kind}, {rows} rows: {:?}", audit.findings);
                // Six rows of which one is far off show no order either.
                if kind != "of something else" {
                    assert_eq!(kinds(&audit), [FindingKind::StrayRow], "{kind}, {rows} rows");
                }
            }
        }
    }
    // Rows at round-off follow no law, and refute none.
    let text = table(9, |h, _| ((5.0 + 0.1 * h * h) * 1e4).round() / 1e4);
    assert_eq!(judge_text(&text, Some(2.0), None).verdict, Verdict::Passed);
}

#[test]
fn steps_longer_than_the_flight_do_not_pass() {
    let mut known = exact(Quantity::Depth, Exact::Free(5.0), true);
    known.values[Quantity::Time as usize] = Exact::Free(1e-3);
    let text = table(6, |h, _| 5.0 + 0.1 * h);
    assert_eq!(judge_against(&text, Some(1.0), &known).verdict, Verdict::Passed);
    known.values[Quantity::Time as usize] = Exact::Free(1e-8);
    assert_eq!(judge_against(&text, Some(1.0), &known).verdict, Verdict::Undecided);
}

#[test]
fn not_finite_values_fail_in_every_spelling() {
    for cell in ["nan", "NaN", "-inf", "Infinity", "1e999", "1.#IND", "-1.#INF", "nan(ind)"] {
        let audit = judge_text(&format!("dt_s,depth_m\n{BASE}16e-6,{cell}\n"), Some(2.0), Some(1.0));
        assert_eq!((audit.verdict, kinds(&audit)), (Verdict::Failed, vec![FindingKind::NotFinite]), "{cell}");
    }
    let audit = judge_text(&format!("dt_s,depth_m\n{BASE}nan,2\n"), None, None);
    assert_eq!((audit.verdict, kinds(&audit)), (Verdict::Failed, vec![FindingKind::NotFinite]));
    let text = audit.quantities[0].reason.clone();
    assert!(text.starts_with("run.csv:6: "), "{text}");
}

#[test]
fn a_bad_column_fails_the_table_and_leaves_the_good_one_judged() {
    let text = "dt_s,depth_m,time_s\n1e-6,1.01,1\n2e-6,1.04,nan\n4e-6,1.16,1\n8e-6,1.64,1\n";
    let audit = judge_text(text, Some(2.0), None);
    assert_eq!(audit.verdict, Verdict::Failed);
    assert_eq!(audit.quantities[0].verdict, Verdict::Passed);
}

#[test]
fn the_form_of_a_table_changes_no_judgement_and_what_is_put_right_is_mentioned() {
    let straight = judge_text(&format!("dt_s,depth_m\n{BASE}"), Some(2.0), None);
    assert_eq!((straight.verdict, kinds(&straight)), (Verdict::Passed, Vec::new()));
    let out_of_order = "dt_s,depth_m\n4e-6,1.16\n1e-6,1.01\n8e-6,1.64\n2e-6,1.04\n1e-6,1.01\n";
    let with_marks = "\u{feff}# from the solver\r\n\"dt_s\", depth_m\r\n1e-6 ,\"1.01\"\r\n2e-6,1.04\r\n\r\n\
                      4e-6,1.16\r\n8e-6,1.64";
    let with_empty_column = "dt_s,depth_m,velocity_m_s\n1e-6,1.01,\n2e-6,1.04,\n4e-6,1.16,\n8e-6,1.64,\n";
    for (text, mentioned) in [
        (out_of_order, &[FindingKind::Unsorted, FindingKind::DuplicateRows][..]),
        (with_marks, &[]),
        (with_empty_column, &[FindingKind::EmptyColumn]),
    ] {
        let audit = judge_text(text, Some(2.0), None);
        assert_eq!((audit.verdict, &kinds(&audit)[..]), (Verdict::Passed, mentioned), "{text}");
        assert_eq!(audit.quantities, straight.quantities, "{text}");
    }
}

#[test]
fn the_judgement_serialises_under_the_names_of_the_contract() {
    let json = serde_json::to_value(judge_text(&format!("dt_s,depth_m\n{BASE}"), Some(2.0), None)).unwrap();
    assert_eq!(json["schema"], "penetrode/audit/1");
    assert_eq!(json["verdict"], "passed");
    let column = &json["quantities"][0];
    assert_eq!((&column["quantity"], &column["class"]), (&"depth".into(), &"converging".into()));
    for name in ["formal_order", "observed_order", "interval", "error_constant", "points", "error_bands"] {
        assert!(!column[name].is_null(), "{name}");
    }
    assert!(column["points"][0]["dt_s"].is_number() && column["points"][0]["error"].is_number());
}
