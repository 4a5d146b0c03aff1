//! Step sizes, number range, rounding and stiffness.

use super::super::scheme::rounding_of;
use super::super::{Subject, USER, Worst, off, solve, worse, worst_of};
use super::{Violations, concrete, end_error, exact, slab, stop};
use crate::integrators::central_difference::stability_limit;
use crate::integrators::{Boundaries, CentralDifference, Detail, Integrator, MethodName, StepLimit, VelocityAt};
use crate::physics::{Outcome, Problem, Stage};
use crate::studies::diagnosis::Asked;
use crate::studies::edge_problems::{Case, cases};
use crate::studies::error::flight_error;
use crate::studies::extreme_scenes::Summary;
use crate::studies::order::{OrderFit, StepError, fit};
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;
use crate::studies::random_scenes::closed_form_errors_at_inputs;
use crate::studies::{Path, extreme_scenes, formal_order, rounding, stability};
use crate::suite::claim::{Claim, Evidence, Found, Judged, Measurement, NotMeasured, Section};
use crate::suite::{Check, Suite, Verdict};

check! {
    /// S1 of `verification/edges.toml`.
    Growth {} in Steps, "relative", by growth, compares (Steps | Itself);
    /// S2 of `verification/edges.toml`.
    StatedStepLimits {} in Steps, "violations", counting stated_step_limits, compares (Steps | Itself);
    /// S3 of `verification/edges.toml`.
    ClosedFormEverywhere {} in Steps, "ulp x condition", by closed_form_everywhere, compares (ClosedForm Loop | FiftyDigits);
    /// S4 of `verification/edges.toml`.
    ToleranceSweep {} in Steps, "error/rtol", by tolerance_sweep, compares (Method | FiftyDigits);
    /// S5 of `verification/edges.toml`.
    SlabRounding {} in Steps, "compensated/plain", by slab_rounding, compares nothing;
    /// S6 of `verification/edges.toml`.
    LadderRatios {} in Steps, "order", by ladder_ratios, compares nothing;
    /// S7 of `verification/edges.toml`.
    OrdersByRule {} in Steps, "violations", counting orders_by_rule, compares (Steps | FiftyDigits);
    /// S8 of `verification/edges.toml`.
    VanishingDrag {} in Steps, "promises", by vanishing_drag, compares nothing;
    /// S8-order of `verification/edges.toml`.
    OrderCrossover {} in Steps, "order", by order_crossover, compares (Steps | FiftyDigits);
    /// S9 of `verification/edges.toml`.
    RandomScenes {} in Steps, "defects", by random_scenes, compares (ClosedForm Taylor Energy Loop | FiftyDigits);
    /// S10 of `verification/edges.toml`.
    DigitsLost {} in Steps, "digits", by digits_lost, compares nothing;
    /// S11 of `verification/edges.toml`.
    ViscousResisting {} in Steps, "force evaluations", by viscous_resisting, compares (Method | FiftyDigits);
    /// S12 of `verification/edges.toml`.
    ViscousDriven {} in Steps, "slope of cost", by viscous_driven, compares nothing;
}

fn growth(_: &Subject<'_>) -> Found {
    let (mut worst, mut remark) = (0.0, Vec::new());
    for velocity in VelocityAt::ALL {
        // With dt = 1 in the study the step moves both groups; drag decays below the limit, to nothing to compare.
        for (drag, parts) in [(0.0, &[0.5, 0.99, 1.0, 1.01, 2.0][..]), (0.3, &[1.01, 2.0][..])] {
            let law = Stage { stiffness: 1.0, viscosity: drag, ..Stage::free() };
            let limit = stability_limit(&law, 1.0, 0.0, velocity);
            for &part in parts {
                let dt = part * limit;
                // Growth by a third a step, and by fourteen at twice the limit, stays within the range of the numbers.
                let steps =
                    [(1.0, 4000), (1.5, 1000)].iter().find(|(most, _)| part <= *most).map_or(100, |found| found.1);
                let found = stability::growth_measured(velocity, dt, drag * dt, steps)?;
                let theory = stability::growth_in_theory(velocity, dt, drag * dt);
                worst = worse(worst, off(found, theory));
                if velocity == VelocityAt::LaggedHalfStep {
                    remark.push(format!("{part} of the limit, r dt/M {:.2}: {found:.5}", drag * dt));
                }
            }
        }
    }
    Ok(Measurement::new(worst).remark(remark.join("; ")))
}

fn stated_step_limits(_: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    let limit = |problem: &Problem, dt, velocity| -> Found<Option<StepLimit>> {
        let scheme = CentralDifference::uniform(dt, velocity, Boundaries::StepEnd);
        Ok(scheme.solve(problem, Detail::Events)?.step_limit)
    };
    let is_right = |limit: Option<StepLimit>, part| limit.is_some_and(|t| t.stable == (part < 1.0));
    // Crater alone: 2/w = 1 s. Tunnel alone at 100 m/s: M/(Q V) = 1 s for the lagged drag.
    let crater = Problem::of_stages(1.0, 1.0, [Stage::crater(4.0, f64::INFINITY)]);
    let tunnel = Problem::of_stages(1.0, 100.0, [Stage::tunnel(1e-3, 0.01)]);
    for part in [0.5, 0.99, 1.01, 2.0] {
        for velocity in VelocityAt::ALL {
            let found = limit(&crater, part, velocity)?;
            seen.expect(is_right(found, part), || format!("crater, {velocity}, {part}: {found:?}"));
        }
        let found = limit(&tunnel, part, VelocityAt::LaggedHalfStep)?;
        seen.expect(is_right(found, part), || format!("lagged drag at {part}: {found:?}"));
    }
    // Springs, viscosities and drags together: the limit is where the linear recurrence of the scheme begins to grow.
    for (stiffness, viscosity, drag) in
        [(4.0, 1.5, 0.0), (4.0, 0.0, 0.01), (0.0, 1.5, 0.0), (0.0, 0.0, 0.01), (9.0, 5.0, 0.03)]
    {
        let stage = Stage { static_force: 50.0, stiffness, viscosity, drag, end: f64::INFINITY };
        let g = viscosity + 2.0 * drag * 100.0;
        for velocity in VelocityAt::ALL {
            let expected = first_growth(stiffness, g, velocity);
            let found = limit(&Problem::of_stages(1.0, 100.0, [stage]), 1e-3, velocity)?;
            let near = |found: StepLimit| (found.limit / expected - 1.0).abs() < 1e-6 || found.limit == expected;
            seen.expect(found.is_some_and(near), || {
                format!("{stage:?}, {velocity}: {found:?}, growth from {expected} s on")
            });
        }
    }
    // A picometre allows steps of 1 ns, 2/w, and a millionth of the kilosecond behind it is a millisecond.
    let stiff = Problem::of_stages(1.0, 1.0, [Stage::crater(4e18, 1e-12), Stage::tunnel(1e-3, 0.0)]);
    for velocity in VelocityAt::ALL {
        let step = CentralDifference { velocity, ..CentralDifference::default() }.time_step(&stiff);
        seen.expect(step < 1e-9, || format!("the default step for {velocity} is {step} s, where 1e-9 s is unstable"));
    }
    // One step of twice the duration: V falls below zero in it, and P + Q V² would drive it on to minus infinity.
    for boundaries in Boundaries::ALL {
        for velocity in VelocityAt::ALL {
            let problem = Problem::of_stages(1.0, 10.0, [Stage::tunnel(100.0, 1.0)]);
            let flight = CentralDifference::uniform(0.2, velocity, boundaries).solve(&problem, Detail::Events)?;
            let found = flight.outcome == Outcome::Stopped && flight.end.velocity <= 0.0 && flight.cost.steps <= 2;
            seen.expect(found, || {
                format!("{velocity}, {boundaries}: {} after {} steps", flight.end, flight.cost.steps)
            });
            let reach = problem.impact_speed * 0.2;
            seen.expect((0.0..=reach).contains(&flight.end.depth), || format!("rest at {} m", flight.end.depth));
        }
    }
    Ok(())
}

/// The least step (s) at which `V' = -(w² x + g V)`, `x' = V` grows in the recurrence of the scheme; infinite without one.
fn first_growth(w_squared: f64, g: f64, velocity: VelocityAt) -> f64 {
    let grows = |h: f64| {
        // x and u = V half a step before, after a step: both from (1, 0) and from (0, 1).
        let step = |(x, u): (f64, f64)| {
            let lagged = w_squared * x + g * u;
            let d = match velocity {
                VelocityAt::LaggedHalfStep => lagged,
                VelocityAt::Centred => w_squared * x + g * (u - 0.5 * h * w_squared * x) / (1.0 + 0.5 * h * g),
                VelocityAt::PredictedHalfStep => w_squared * x + g * (u - 0.5 * h * lagged),
            };
            (x + h * (u - h * d), u - h * d)
        };
        let ((a, c), (b, d)) = (step((1.0, 0.0)), step((0.0, 1.0)));
        let (mean, product) = (0.5 * (a + d), a * d - b * c);
        let apart = mean * mean - product;
        let radius = if apart > 0.0 { mean.abs() + apart.sqrt() } else { product.sqrt() };
        // A motion without a spring keeps x, and one without friction its swing.
        radius > 1.0 + 1e-9
    };
    let mut steps = (0..4000).map(|count| 1e-3 * 1.005_f64.powi(count)).take_while(|step| *step < 1e4);
    let Some(growing) = steps.find(|step| grows(*step)) else { return f64::INFINITY };
    let (mut low, mut high) = (growing / 1.005, growing);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        *(if grows(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

fn closed_form_everywhere(subject: &Subject<'_>) -> Found {
    let mut worst = Worst::default();
    for index in (0..300).step_by(2) {
        let scene = extreme_scenes::scene(subject.context.seed, index);
        let errors =
            closed_form_errors_at_inputs(&scene).map_err(|e| NotMeasured::broken(format!("scene {index}: {e}")))?;
        if let Some((error, quantity)) = errors.worst() {
            worst.take(error, || format!("{quantity} of scene {index}"));
        }
    }
    Ok(worst.measurement())
}

fn tolerance_sweep(subject: &Subject<'_>) -> Found {
    let mut worst = 0.0;
    let mut points = Vec::new();
    for problem in [stop(true)?, slab(true).resolve(600.0)?] {
        let exact = exact(&problem)?.values();
        for power in -12..=-3 {
            let rtol = 10f64.powi(power);
            let flight = solve(&subject.method(Some(rtol))?, &problem, Detail::Events)?;
            let error = end_error(&flight, &exact, problem.impact_speed);
            worst = worse(worst, (error - 16.0 * f64::EPSILON).max(0.0) / rtol);
            points.push((rtol, error));
        }
    }
    Ok(Measurement::new(worst).evidence(Evidence::Series(points)))
}

fn slab_rounding(_: &Subject<'_>) -> Found {
    rounding_of(&stop(true)?, 8, 17)
}

/// Fitted order of `quantity` over the steps `sizes`.
fn fitted(problem: &Problem, scheme: (VelocityAt, Boundaries), quantity: Quantity, sizes: &[f64]) -> Found<OrderFit> {
    let exact = exact(problem)?.values();
    let mut points = Vec::with_capacity(sizes.len());
    for &dt in sizes {
        let flight = CentralDifference::uniform(dt, scheme.0, scheme.1).solve(problem, Detail::Events)?;
        let error = flight_error(quantity, &flight, &exact, problem.impact_speed)
            .ok_or_else(|| NotMeasured::broken(format!("no {quantity} at {dt} s")))?;
        points.push(StepError::new(dt, error));
    }
    Ok(fit(&points)?)
}

fn order_of(fit: &OrderFit) -> f64 {
    fit.line.map_or(f64::NAN, |line| line.order)
}

/// `count` random steps over two decades of the duration of the motion of `problem`, up to the share `to` of it.
fn random_steps(mut random: Random, problem: &Problem, to: f64, count: usize) -> Found<Vec<f64>> {
    let time = exact(problem)?.end.time.hi();
    Ok((0..count).map(|_| time * random.log_uniform(0.01 * to, to)).collect())
}

fn ladder_ratios(subject: &Subject<'_>) -> Found {
    let problem = stop(true)?;
    let scheme = (VelocityAt::Centred, Boundaries::Landed);
    let time = exact(&problem)?.end.time.hi();
    let random = random_steps(subject.random("S6"), &problem, 1e-2, 40)?;
    let mut ladders = vec![("random", random)];
    for (name, ratio) in [("1.1", 1.1_f64), ("1.3", 1.3), ("golden", 1.618_033_988_749_895), ("2", 2.0)] {
        let count = (100f64.ln() / ratio.ln()).ceil() as i32;
        ladders.push((name, (0..=count).map(|i| 1e-2 * time * ratio.powi(-i)).collect()));
    }
    let (mut worst, mut remark) = (0.0, Vec::new());
    for (name, sizes) in ladders {
        let order = order_of(&fitted(&problem, scheme, Quantity::Depth, &sizes)?);
        worst = worse(worst, (order - 2.0).abs());
        remark.push(format!("{name}: {order:.3}"));
    }
    Ok(Measurement::new(worst).remark(remark.join(", ")))
}

fn orders_by_rule(subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    for drag in [false, true] {
        let problem = stop(drag)?;
        let exact = exact(&problem)?.values();
        let path = Path::of(&problem, &exact);
        for velocity in VelocityAt::ALL {
            for boundaries in Boundaries::ALL {
                for quantity in [Quantity::Depth, Quantity::Time] {
                    let Some(formal) = formal_order(velocity, boundaries, &path, quantity) else { continue };
                    // Above 3e-3 the next power still bends the depth of a lagged drag: 26 of 202 seeds missed the order.
                    // Over 1,002 seeds these 90 steps confirmed each order.
                    let sizes = random_steps(subject.random("S7"), &problem, 3e-3, 90)?;
                    let fit = fitted(&problem, (velocity, boundaries), quantity, &sizes)?;
                    seen.expect(fit.verdict(formal) == Verdict::Passed, || {
                        let order = order_of(&fit);
                        format!("{velocity}, {boundaries}, {quantity}: {order:.2} of {formal}, {}", fit.reason)
                    });
                }
            }
        }
    }
    Ok(())
}

fn vanishing_drag(subject: &Subject<'_>) -> Found {
    let base = concrete(0.9, 400.0, [4.5e6, 0.0538], [2.4e5, 0.0]);
    let plain = subject.flight(&base)?;
    let mut worst = 0.0;
    for power in [-300, -150, -30, -20, -16, -12, -9, -6] {
        let mut problem = base.clone();
        problem.stages[1].drag = 10f64.powi(power);
        let flight = subject.flight(&problem)?;
        let share = problem.stages[1].drag * 400.0 * 400.0 / 2.4e5;
        for error in [off(flight.end.depth, plain.end.depth), off(flight.end.time, plain.end.time)] {
            worst = worse(worst, (error - share).max(0.0));
        }
    }
    Ok(Measurement::new(worst / subject.promise()))
}

fn order_crossover(subject: &Subject<'_>) -> Found {
    let (mut worst, mut remark) = (0.0, Vec::new());
    for (drag, formal) in [(0.0, 2.0), (1e-9, 2.0), (1.0, 1.0)] {
        let problem = concrete(0.9, 400.0, [4.5e6, 0.0538], [2.4e5, drag]);
        let sizes = random_steps(subject.random("S8"), &problem, 1e-2, 40)?;
        let scheme = (VelocityAt::LaggedHalfStep, Boundaries::Landed);
        let order = order_of(&fitted(&problem, scheme, Quantity::Depth, &sizes)?);
        worst = worse(worst, (order - formal).abs());
        remark.push(format!("Q = {drag:e} kg/m: {order:.2}"));
    }
    Ok(Measurement::new(worst).remark(remark.join(", ")))
}

#[expect(clippy::unnecessary_wraps, reason = "every check has one signature")]
fn random_scenes(subject: &Subject<'_>) -> Found {
    Ok(defects_of(&extreme_scenes::run(2000, subject.context.seed, &|| {})))
}

fn defects_of(summary: &Summary) -> Measurement {
    let undecided: u64 = summary.tallies.values().map(|tally| tally.undecided).sum();
    let Summary { scenes, unresolved, .. } = summary;
    let first = summary.defects.first().map(|d| format!("; scene {}: {}", d.index, d.what)).unwrap_or_default();
    Measurement {
        verdict: (scenes == unresolved).then_some(Verdict::Undecided),
        ..Measurement::new(summary.defect_count as f64)
            .cases(usize::try_from(*scenes).unwrap_or(usize::MAX))
            .remark(format!("{scenes} scenes, {unresolved} unresolved, {undecided} outcomes undecided{first}"))
    }
}

/// The random scenes of `stress --cases` as one more claim of `suite`, in place of those that it draws itself; `wall_ms`
/// is the time spent on them (ms).
pub fn judged_random_scenes(suite: &Suite, summary: &Summary, wall_ms: f64) -> Option<Judged> {
    let drawn = suite.claims.iter().find(|claim| matches!(claim.check, Check::RandomScenes(_)))?;
    let claim = Claim {
        id: "random-scenes".to_owned(),
        table: "random-scenes".to_owned(),
        statement: "every random scene: outcomes right or undecided, every number within its limit".to_owned(),
        section: Section::Random,
        reason: "zero: an outcome is right, or inside its own error bar; numbers keep to 64 ulp times their condition number"
            .to_owned(),
        ..drawn.clone()
    };
    Some(Judged::new(claim, Ok(defects_of(summary)), wall_ms))
}

/// What another program answered at the edges as claims of `suite`, one each case; answers that are of no case are to
/// random problems. `wall_ms` is the time spent on all (ms).
pub fn judged_answers(suite: &Suite, asked: &[Asked], wall_ms: f64) -> Vec<Judged> {
    let is_random = |claim: &&Claim| matches!(claim.check, Check::RandomScenes(_));
    let random =
        suite.claims.iter().find(is_random).map(|claim| (claim, "random", "every random problem has its answer"));
    let of_case = |case: &Case| {
        suite.claims.iter().find(|claim| claim.table == case.id).map(|claim| (claim, case.id, case.statement))
    };
    let cases = cases();
    let parts = cases.iter().filter_map(of_case).chain(random);
    let judged = parts.filter_map(|(model, name, statement)| {
        let is_of = |asked: &&Asked| {
            let case = asked.id.split('-').next().unwrap_or_default();
            case == name || (name == "random" && !cases.iter().any(|known| known.id == case))
        };
        let answers: Vec<&Asked> = asked.iter().filter(is_of).collect();
        let count = |is: fn(Verdict) -> bool| answers.iter().filter(|asked| is(asked.verdict)).count();
        let (judged, wrong) =
            (count(|verdict| verdict != Verdict::Skipped), count(|verdict| verdict == Verdict::Failed));
        let claim = Claim {
            id: format!("{name}/{USER}"),
            table: name.to_owned(),
            statement: statement.to_owned(),
            method: None,
            limit: 0.0,
            unit: "wrong answers",
            reason: "zero: outcome, depth, time and velocity, each within 1000 tolerances times its condition"
                .to_owned(),
            ..model.clone()
        };
        let first = answers.iter().find(|asked| asked.verdict == Verdict::Failed);
        let first = first.map(|asked| format!("; first {}: {}", asked.id, asked.reason)).unwrap_or_default();
        let found = Measurement::new(if judged == 0 { f64::NAN } else { wrong as f64 })
            .cases(judged)
            .remark(format!("{judged} answers judged{first}"));
        let share = answers.len() as f64 / asked.len().max(1) as f64;
        (!answers.is_empty()).then(|| Judged::new(claim, Ok(found), share * wall_ms))
    });
    judged.collect()
}

fn digits_lost(_: &Subject<'_>) -> Found {
    let problem = stop(true)?;
    let dt = exact(&problem)?.end.time.hi() / 2000.0;
    let rows = rounding::digits_lost(&problem, dt)?;
    let (mut worst, mut remark) = (0.0, Vec::new());
    for row in &rows {
        let most = worst_of(row.lost.iter().map(|(_, lost)| *lost));
        worst = worse(worst, most);
        remark.push(format!("{} {}: {most:.1}", row.method, row.number));
    }
    Ok(Measurement::new(worst).remark(format!("digits lost at most: {}", remark.join(", "))))
}

/// Viscosity r (kg/s) on 1 kg from 10 m/s, with 10 N and 100 N/m that resist.
fn viscous_resisting(subject: &Subject<'_>) -> Found {
    let mut points = Vec::new();
    for power in 0..=8 {
        let rate = 10f64.powi(power);
        let law = Stage { static_force: 10.0, stiffness: 100.0, viscosity: rate, ..Stage::free() };
        let problem = Problem::of_stages(1.0, 10.0, [law]);
        let (flight, exact) = subject.beside_exact(&problem)?;
        // An error of the velocity, relative to V0, moves the time of rest by dV/a: V0/(a T) times as much of T.
        let deceleration = law.force(exact.end.depth, 0.0) / problem.mass;
        let condition = (problem.impact_speed / (deceleration * exact.end.time)).max(1.0);
        let error = worse(off(flight.end.depth, exact.end.depth), off(flight.end.time, exact.end.time) / condition);
        holds!(error <= 1e3 * subject.promise(), "off by {error:e} at r/M = {rate:e}");
        points.push((rate, flight.cost.force_evaluations as f64));
    }
    let most = worst_of(points.iter().map(|point| point.1));
    Ok(Measurement::new(most).evidence(Evidence::Series(points)))
}

/// The driven scene of docs/theory.md, section 1, with its drive in proportion to r, so that the slow motion stays the same.
fn viscous_driven(subject: &Subject<'_>) -> Found {
    let explicit = matches!(subject.method_name(), MethodName::Taylor | MethodName::Tsit45);
    // An explicit method needs about a thousand steps for each factor ten.
    let rates: &[f64] = if explicit { &[1e2, 1e3, 1e4] } else { &[1e2, 1e3, 1e4, 1e5, 1e6] };
    let mut points = Vec::new();
    for &rate in rates {
        let law = Stage { static_force: -rate, stiffness: 0.1 * rate, viscosity: rate, ..Stage::free() };
        let problem = Problem::of_stages(1.0, 1.0, [law]).with_exit(9.0);
        let flight = subject.flight(&problem)?;
        // x = 10 (1 - e^(-0.1 t)) but for the transient, of the order of M/r: t = 10 ln 10 s.
        let error = off(flight.end.time, 10.0 * 10f64.ln());
        let allowed = 2.0 / rate + 1e3 * subject.promise();
        holds!(error <= allowed, "leaves after {} s at r/M = {rate:e}", flight.end.time);
        points.push((rate, flight.cost.force_evaluations as f64));
    }
    let slope = rounding::slope(points.iter().copied());
    let last = points.last().map_or(f64::NAN, |p| p.1);
    let remark = format!("cost ~ (r/M)^{slope:.2}, {last} evaluations at {:.0e} /s", rates[rates.len() - 1]);
    // For an explicit method the claim is that the scene is stiff.
    let value = if explicit { (0.5 - slope).max(0.0) } else { slope.max(0.0) };
    Ok(Measurement::new(value).remark(remark).evidence(Evidence::Series(points)))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a check that cannot be measured has failed")]
mod tests {
    use crate::suite::checks::{Asked, Context, Memo, PeerAnswers, Subject};
    use crate::suite::{Scenes, Suite};

    #[test]
    fn orders_by_rule_are_confirmed_whatever_the_seed() {
        let suite = Suite::edges().unwrap();
        let claim = suite.claims.iter().find(|claim| claim.id == "S7").unwrap();
        let (scenes, peers, memo) = (Scenes::default(), PeerAnswers::default(), Memo::default());
        // The last two once fell on steps outside the asymptotic range.
        for seed in [1, u64::MAX - 1, u64::MAX] {
            let context =
                Context { scenes: &scenes, peers: &peers, memo: &memo, program: None, points: &[], judged: None, seed };
            let measured =
                claim.check.measure(&Subject { claim, context, flaw: None, asked: &Asked::default() }).unwrap();
            assert!(measured.value <= claim.limit, "seed {seed}: {}", measured.remark);
        }
    }
}
