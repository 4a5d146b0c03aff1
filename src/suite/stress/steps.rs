//! Step sizes, number range, rounding and stiffness.

use super::{ALL_ADAPTIVE, Case, Subject, VISCOUS, Violations, concrete, exact, resolve, slab, staged, worse};
use crate::integrators::central_difference::stability_limit;
use crate::integrators::{
    Boundaries, CentralDifference, Detail, Integrator, MethodName, StepLimit, Taylor, VelocityAt,
};
use crate::physics::{Outcome, Problem, Scene, Stage};
use crate::studies::extreme_scenes::exceeds;
use crate::studies::order::{OrderVerdict, StepError, fit};
use crate::studies::quantity::Quantity;
use crate::studies::random::Random;
use crate::studies::random_scenes::closed_form_errors_at_inputs;
use crate::studies::{Path, extreme_scenes, formal_order, rounding, stability};
use crate::suite::checks::scheme;
use crate::suite::claim::{Evidence, Measurement, NotMeasured};

const NONE: &[MethodName] = &[];
const RULES: [VelocityAt; 3] = [VelocityAt::LaggedHalfStep, VelocityAt::Centred, VelocityAt::PredictedHalfStep];

/// Without tr-bdf2: of second order, it takes tens of thousands of steps at this tolerance whatever the stage.
const RESISTING: &[MethodName] =
    &[MethodName::Taylor, MethodName::Tsit45, MethodName::Bdf, MethodName::Esdirk34, MethodName::Adaptive];

pub(super) const CASES: &[Case] = &[
    Case {
        id: "S1",
        statement: "the central difference grows per step as theory says at 0.5, 0.99, 1, 1.01 and 2 times its limit, with and without drag",
        reason: "2e-3: the reach of 4000 steps tells a growth of one apart from the linear growth at the limit to 1/2400",
        limit: 2e-3,
        unit: "relative",
        methods: NONE,
        measure: growth,
    },
    Case {
        id: "S1-map",
        statement: "the measured boundary of stability lies where theory draws it over the drag group Q V dt/M, for each velocity rule",
        reason: "2e-3 of w dt: within that of the limit the later half of 4000 steps does not yet reach half as far again",
        limit: 2e-3,
        unit: "relative",
        methods: NONE,
        measure: stability_map,
    },
    Case {
        id: "S2",
        statement: "a step beyond the limit of stiffness or lagged drag is told, one within is not, and a step that overshoots rest ends the flight",
        reason: "zero: an unstable run that is not told looks like any other",
        limit: 0.0,
        unit: "violations",
        methods: NONE,
        measure: limits_are_told,
    },
    Case {
        id: "S3",
        statement: "the closed form holds over the whole range of I, N, H/d, k and d",
        reason: "8 ulp times the condition number: what the closed form states",
        limit: 8.0,
        unit: "ulp x condition",
        methods: NONE,
        measure: closed_form_everywhere,
    },
    Case {
        id: "S4",
        statement: "from rtol 1e-3 to 1e-12 the error stays in proportion to the tolerance",
        reason: "a factor 1000: a flight adds up some tens of local errors, and a solver may control each to a few tolerances; \
                 an error that stops following the tolerance exceeds any factor",
        limit: 1000.0,
        unit: "error/rtol",
        methods: ALL_ADAPTIVE,
        measure: tolerance_sweep,
    },
    Case {
        id: "S5",
        statement: "over 2^8 to 2^17 steps truncation falls at second order, and plain sums cost more than compensated ones",
        reason: "a twentieth: by 2^17 steps compensated sums must leave at most that part of the rounding of plain ones",
        limit: 0.05,
        unit: "compensated/plain",
        methods: NONE,
        measure: floor,
    },
    Case {
        id: "S6",
        statement: "ladders of ratio 1.1, 1.3, the golden ratio and random ones give the same order of the rest depth",
        reason: "0.1: half of what separates neighbouring orders is 0.5, and the fits' own scatter is below 0.05",
        limit: 0.1,
        unit: "order",
        methods: NONE,
        measure: ratios_of_ladders,
    },
    Case {
        id: "S7",
        statement: "depth and time of rest converge at the order of their velocity and boundary rule, with and without drag",
        reason: "zero: the verdict band of the fit holds the formal order and no neighbour",
        limit: 0.0,
        unit: "violations",
        methods: NONE,
        measure: orders_by_rule,
    },
    Case {
        id: "S8",
        statement: "Q -> 0 meets Q = 0: depth and time differ by no more than the drag's share of the work",
        reason: "100 promises of the method beyond Q V0²/P: the drag's work is at most that part of the static one",
        limit: 100.0,
        unit: "promises",
        methods: ALL_ADAPTIVE,
        measure: vanishing_drag,
    },
    Case {
        id: "S8-order",
        statement: "a lagged drag is first order where it is felt and second where dt Q V/M falls below (w dt)²",
        reason: "0.2: the crossover leaves some of the other order in either ladder",
        limit: 0.2,
        unit: "order",
        methods: NONE,
        measure: crossover_of_orders,
    },
    Case {
        id: "S9",
        statement: "2000 random scenes over the whole range, half of them at the edges: every outcome right or undecided, every number within its limit",
        reason: "zero: the limits are those of the study of extreme scenes",
        limit: 0.0,
        unit: "defects",
        methods: NONE,
        measure: random_scenes,
    },
    Case {
        id: "S10",
        statement: "in f32 and f64 the kernels lose few digits against double-double: the series almost none, the steps by their number",
        reason: "2.5 digits: Taylor and energy round some tens of times, and the central difference 2000 times",
        limit: 2.5,
        unit: "digits",
        methods: NONE,
        measure: digits,
    },
    Case {
        id: "S11",
        statement: "on a stage that resists, r/M from 1 to 1e8 /s costs no more than a logarithm, and the answer holds",
        reason: "10,000 force evaluations: such a stage is never stiff (theory section 1), rest comes inside the transient",
        limit: 1e4,
        unit: "force evaluations",
        methods: RESISTING,
        measure: viscous_resisting,
    },
    Case {
        id: "S12",
        statement: "on a driven stage implicit cost stays flat from r/M 1e2 to 1e6 /s, explicit cost grows in proportion, and the answers agree",
        reason: "a slope of 0.25 of cost over r/M for implicit methods and `adaptive`; explicit ones must show 0.5 at least, or the \
                 scene is not stiff and shows nothing",
        limit: 0.25,
        unit: "slope of cost",
        methods: VISCOUS,
        measure: viscous_driven,
    },
];

fn growth(_: Subject) -> Result<Measurement, NotMeasured> {
    let (mut worst, mut remark) = (0.0, Vec::new());
    for velocity in RULES {
        // With dt = 1 in the study the step moves both groups; drag decays below the limit, to nothing to compare.
        for (drag, parts) in [(0.0, &[0.5, 0.99, 1.0, 1.01, 2.0][..]), (0.3, &[1.01, 2.0][..])] {
            let law = Stage { static_force: 0.0, stiffness: 1.0, viscosity: drag, drag: 0.0, end: f64::INFINITY };
            let limit = stability_limit(&law, 1.0, 0.0, velocity);
            for &part in parts {
                let dt = part * limit;
                // Growth by a third a step, and by fourteen at twice the limit, stays within the range of the numbers.
                let steps = if part <= 1.0 {
                    4000
                } else if part < 1.5 {
                    1000
                } else {
                    100
                };
                let found = stability::growth_measured(velocity, dt, drag * dt, steps).map_err(NotMeasured::broken)?;
                let theory = stability::growth_in_theory(velocity, dt, drag * dt);
                worst = worse(worst, (found / theory - 1.0).abs());
                if velocity == VelocityAt::LaggedHalfStep {
                    remark.push(format!("{part} of the limit, r dt/M {:.2}: {found:.5}", drag * dt));
                }
            }
        }
    }
    Ok(Measurement::new(worst).remark(remark.join("; ")))
}

fn stability_map(_: Subject) -> Result<Measurement, NotMeasured> {
    scheme::stability_map(12)
}

fn limits_are_told(_: Subject) -> Result<Measurement, NotMeasured> {
    let mut seen = Violations::default();
    let fly = |problem: &Problem, dt: f64, velocity| {
        CentralDifference::uniform(dt, velocity, Boundaries::StepEnd)
            .fly(problem, Detail::Events)
            .map_err(NotMeasured::broken)
    };
    // Crater alone: 2/w = 1 s. Tunnel alone at 100 m/s: M/(Q V) = 1 s for the lagged drag.
    let crater = staged(1.0, 1.0, f64::INFINITY, &[Stage::crater(4.0, f64::INFINITY)]);
    let tunnel = staged(1.0, 100.0, f64::INFINITY, &[Stage::tunnel(1e-3, 0.01)]);
    for part in [0.5, 0.99, 1.01, 2.0] {
        for velocity in RULES {
            let told = fly(&crater, part, velocity)?.step_limit;
            seen.expect(told.is_some_and(|t| t.stable == (part < 1.0)), || {
                format!("crater, {velocity}, {part}: {told:?}")
            });
        }
        let told: Option<StepLimit> = fly(&tunnel, part, VelocityAt::LaggedHalfStep)?.step_limit;
        seen.expect(told.is_some_and(|t| t.stable == (part < 1.0)), || format!("lagged drag at {part}: {told:?}"));
    }
    // One step of twice the flight: V falls below zero in it, and P + Q V² would drive it on to minus infinity.
    for boundaries in [Boundaries::StepEnd, Boundaries::Interpolated, Boundaries::Landed] {
        for velocity in RULES {
            let problem = staged(1.0, 10.0, f64::INFINITY, &[Stage::tunnel(100.0, 1.0)]);
            let flight = CentralDifference::uniform(0.2, velocity, boundaries)
                .fly(&problem, Detail::Events)
                .map_err(NotMeasured::broken)?;
            let found = flight.outcome == Outcome::Stopped && flight.end.velocity <= 0.0 && flight.cost.steps <= 2;
            seen.expect(found, || {
                format!("{velocity}, {boundaries}: {} after {} steps", flight.end, flight.cost.steps)
            });
            let reach = problem.impact_speed * 0.2;
            seen.expect((0.0..=reach).contains(&flight.end.depth), || format!("rest at {} m", flight.end.depth));
        }
    }
    Ok(seen.measurement())
}

fn closed_form_everywhere(subject: Subject) -> Result<Measurement, NotMeasured> {
    let mut worst = 0.0;
    let mut at = String::new();
    for index in 0..150 {
        let scene = extreme_scenes::scene(subject.seed, 2 * index);
        let errors = closed_form_errors_at_inputs(&scene)
            .map_err(|e| NotMeasured::broken(format!("scene {}: {e}", 2 * index)))?;
        if let Some((error, quantity)) = errors.worst() {
            if exceeds(error, worst) {
                at = format!("{quantity} of scene {}", 2 * index);
            }
            worst = worse(worst, error);
        }
    }
    Ok(Measurement::new(worst).remark(at))
}

fn tolerance_sweep(subject: Subject) -> Result<Measurement, NotMeasured> {
    let mut worst = 0.0;
    let mut points = Vec::new();
    for problem in [resolve(&Scene { thickness: None, ..slab(true) }, 400.0)?, resolve(&slab(true), 600.0)?] {
        let exact = exact(&problem)?.values();
        for power in -12..=-3 {
            let rtol = 10f64.powi(power);
            let method = subject.build(Some(rtol))?;
            let flight = method.integrator().fly(&problem, Detail::Events).map_err(NotMeasured::broken)?;
            let mut error = (flight.end.depth / exact.end.depth - 1.0).abs();
            error = worse(error, (flight.end.time / exact.end.time - 1.0).abs());
            error = worse(error, (flight.end.velocity - exact.end.velocity).abs() / problem.impact_speed);
            worst = worse(worst, (error - 16.0 * f64::EPSILON).max(0.0) / rtol);
            points.push((rtol, error));
        }
    }
    Ok(Measurement::new(worst).evidence(Evidence::Series { abscissa: "rtol", ordinate: "error", points }))
}

fn floor(_: Subject) -> Result<Measurement, NotMeasured> {
    scheme::rounding_floor(&resolve(&Scene { thickness: None, ..slab(true) }, 400.0)?, 8, 17)
}

/// Fitted order of `quantity` over the steps `sizes`.
fn fitted(
    problem: &Problem,
    scheme: (VelocityAt, Boundaries),
    quantity: Quantity,
    sizes: &[f64],
) -> Result<(f64, crate::studies::order::OrderFit), NotMeasured> {
    let exact = Taylor::default().fly(problem, Detail::Events).map_err(NotMeasured::broken)?;
    let mut points = Vec::with_capacity(sizes.len());
    for &dt in sizes {
        let flight = CentralDifference::uniform(dt, scheme.0, scheme.1)
            .fly(problem, Detail::Events)
            .map_err(NotMeasured::broken)?;
        let error = crate::studies::error::flight_error(quantity, &flight, &exact, problem.impact_speed)
            .ok_or_else(|| NotMeasured::broken(format!("no {quantity} at {dt} s")))?;
        points.push(StepError::new(dt, error));
    }
    let fit = fit(&points).map_err(NotMeasured::broken)?;
    let order = fit.line.map_or(f64::NAN, |line| line.order);
    Ok((order, fit))
}

/// `count` random steps over `from` to `to` of the flight time of `problem`.
fn random_steps(
    seed: u64,
    part: &str,
    problem: &Problem,
    from: f64,
    to: f64,
    count: usize,
) -> Result<Vec<f64>, NotMeasured> {
    let time = exact(problem)?.end.time.hi();
    let mut random = Random::for_part(seed, part);
    Ok((0..count).map(|_| time * random.log_uniform(from, to)).collect())
}

fn ratios_of_ladders(subject: Subject) -> Result<Measurement, NotMeasured> {
    let problem = resolve(&Scene { thickness: None, ..slab(true) }, 400.0)?;
    let scheme = (VelocityAt::Centred, Boundaries::Landed);
    let time = exact(&problem)?.end.time.hi();
    let random = random_steps(subject.seed, "S6", &problem, 1e-4, 1e-2, 40)?;
    let mut ladders = vec![("random", random)];
    for (name, ratio) in [("1.1", 1.1_f64), ("1.3", 1.3), ("golden", 1.618_033_988_749_895), ("2", 2.0)] {
        let count = (100f64.ln() / ratio.ln()).ceil() as i32;
        ladders.push((name, (0..=count).map(|i| 1e-2 * time * ratio.powi(-i)).collect()));
    }
    let (mut worst, mut remark) = (0.0, Vec::new());
    for (name, sizes) in ladders {
        let (order, _) = fitted(&problem, scheme, Quantity::Depth, &sizes)?;
        worst = worse(worst, (order - 2.0).abs());
        remark.push(format!("{name}: {order:.3}"));
    }
    Ok(Measurement::new(worst).remark(remark.join(", ")))
}

fn orders_by_rule(subject: Subject) -> Result<Measurement, NotMeasured> {
    let mut seen = Violations::default();
    for drag in [false, true] {
        let problem = resolve(&Scene { thickness: None, ..slab(drag) }, 400.0)?;
        let exact = Taylor::default().fly(&problem, Detail::Events).map_err(NotMeasured::broken)?;
        let path = Path::of(&problem, &exact);
        for velocity in RULES {
            for boundaries in [Boundaries::StepEnd, Boundaries::Interpolated, Boundaries::Landed] {
                for quantity in [Quantity::Depth, Quantity::Time] {
                    let Some(formal) = formal_order(velocity, boundaries, &path, quantity) else { continue };
                    // Above 3e-3 the next power still bends the depth of a lagged drag: 26 of 202 seeds missed the order.
                    // Over 1,002 seeds these 90 steps bear out each order.
                    let sizes = random_steps(subject.seed, "S7", &problem, 3e-5, 3e-3, 90)?;
                    let (order, fit) = fitted(&problem, (velocity, boundaries), quantity, &sizes)?;
                    seen.expect(fit.verdict(formal) == OrderVerdict::Pass, || {
                        format!("{velocity}, {boundaries}, {quantity}: {order:.2} of {formal}, {}", fit.reason)
                    });
                }
            }
        }
    }
    Ok(seen.measurement())
}

fn vanishing_drag(subject: Subject) -> Result<Measurement, NotMeasured> {
    let base = concrete(0.9, 400.0, f64::INFINITY, (4.5e6, 0.0538), (2.4e5, 0.0));
    let plain = subject.fly(&base)?;
    let mut worst = 0.0;
    for power in [-300, -150, -30, -20, -16, -12, -9, -6] {
        let mut problem = base.clone();
        problem.stages[1].drag = 10f64.powi(power);
        let flight = subject.fly(&problem)?;
        let share = problem.stages[1].drag * 400.0 * 400.0 / 2.4e5;
        for off in [flight.end.depth / plain.end.depth - 1.0, flight.end.time / plain.end.time - 1.0] {
            worst = worse(worst, (off.abs() - share).max(0.0));
        }
    }
    Ok(Measurement::new(worst / subject.promise()))
}

fn crossover_of_orders(subject: Subject) -> Result<Measurement, NotMeasured> {
    let (mut worst, mut remark) = (0.0, Vec::new());
    for (drag, formal) in [(0.0, 2.0), (1e-9, 2.0), (1.0, 1.0)] {
        let problem = concrete(0.9, 400.0, f64::INFINITY, (4.5e6, 0.0538), (2.4e5, drag));
        let sizes = random_steps(subject.seed, "S8", &problem, 1e-4, 1e-2, 40)?;
        let scheme = (VelocityAt::LaggedHalfStep, Boundaries::Landed);
        let (order, _) = fitted(&problem, scheme, Quantity::Depth, &sizes)?;
        worst = worse(worst, (order - formal).abs());
        remark.push(format!("Q = {drag:e} kg/m: {order:.2}"));
    }
    Ok(Measurement::new(worst).remark(remark.join(", ")))
}

#[expect(clippy::unnecessary_wraps, reason = "one signature for every case")]
fn random_scenes(subject: Subject) -> Result<Measurement, NotMeasured> {
    let summary = extreme_scenes::run(2000, subject.seed, &|| {});
    let undecided: u64 = summary.tallies.values().map(|tally| tally.undecided).sum();
    let mut remark = format!("{} scenes, {undecided} flights undecided", summary.scenes);
    if let Some(defect) = summary.defects.first() {
        remark = format!("{remark}; scene {}: {}", defect.index, defect.what);
    }
    Ok(Measurement::new(summary.defect_count as f64).remark(remark))
}

fn digits(_: Subject) -> Result<Measurement, NotMeasured> {
    let problem = resolve(&Scene { thickness: None, ..slab(true) }, 400.0)?;
    let dt = exact(&problem)?.end.time.hi() / 2000.0;
    let rows = rounding::digits_lost(&problem, dt).map_err(NotMeasured::broken)?;
    let (mut worst, mut remark) = (0.0, Vec::new());
    for row in &rows {
        let most = row.lost.iter().fold(0.0, |most, (_, lost)| worse(most, *lost));
        worst = worse(worst, most);
        remark.push(format!("{} {}: {most:.1}", row.method, row.number));
    }
    Ok(Measurement::new(worst).remark(format!("digits lost at most: {}", remark.join(", "))))
}

/// Viscosity r [kg/s] on 1 kg from 10 m/s, with 10 N and 100 N/m that resist.
fn viscous_resisting(subject: Subject) -> Result<Measurement, NotMeasured> {
    let mut worst = 0.0;
    let mut points = Vec::new();
    for power in 0..=8 {
        let rate = 10f64.powi(power);
        let law = Stage { static_force: 10.0, stiffness: 100.0, viscosity: rate, drag: 0.0, end: f64::INFINITY };
        let problem = staged(1.0, 10.0, f64::INFINITY, &[law]);
        let (flight, exact) = (subject.fly(&problem)?, exact(&problem)?.values());
        // An error of the velocity, relative to V0, moves the time of rest by dV/a: V0/(a T) times as much of T.
        let deceleration = law.force(exact.end.depth, 0.0) / problem.mass;
        let condition = (problem.impact_speed / (deceleration * exact.end.time)).max(1.0);
        let off = worse(
            (flight.end.depth / exact.end.depth - 1.0).abs(),
            (flight.end.time / exact.end.time - 1.0).abs() / condition,
        );
        if exceeds(off, 1e3 * subject.promise()) {
            return Err(NotMeasured::broken(format!("off by {off:e} at r/M = {rate:e}")));
        }
        worst = worse(worst, flight.cost.force_evaluations as f64);
        points.push((rate, flight.cost.force_evaluations as f64));
    }
    Ok(Measurement::new(worst).evidence(Evidence::Series {
        abscissa: "r/M, 1/s",
        ordinate: "force evaluations",
        points,
    }))
}

/// The driven scene of theory section 1 with its drive in proportion to r, so that the slow motion stays the same.
fn viscous_driven(subject: Subject) -> Result<Measurement, NotMeasured> {
    let explicit = matches!(subject.method(), MethodName::Taylor | MethodName::Tsit45);
    // An explicit method needs about a thousand steps for each factor ten.
    let rates: &[f64] = if explicit { &[1e2, 1e3, 1e4] } else { &[1e2, 1e3, 1e4, 1e5, 1e6] };
    let mut points = Vec::new();
    for &rate in rates {
        let law = Stage { static_force: -rate, stiffness: 0.1 * rate, viscosity: rate, drag: 0.0, end: f64::INFINITY };
        let problem = staged(1.0, 1.0, 9.0, &[law]);
        let flight = subject.fly(&problem)?;
        // x = 10 (1 - e^(-0.1 t)) but for the transient, of the order of M/r: t = 10 ln 10 s.
        let off = (flight.end.time / (10.0 * 10f64.ln()) - 1.0).abs();
        if exceeds(off, 2.0 / rate + 1e3 * subject.promise()) {
            return Err(NotMeasured::broken(format!("leaves after {} s at r/M = {rate:e}", flight.end.time)));
        }
        points.push((rate, flight.cost.force_evaluations as f64));
    }
    let slope = rounding::slope(points.iter().copied());
    let last = points.last().map_or(f64::NAN, |p| p.1);
    let remark = format!("cost ~ (r/M)^{slope:.2}, {last} evaluations at {:.0e} /s", rates[rates.len() - 1]);
    // For an explicit method the claim is that the scene is stiff.
    let value = if explicit { (0.5 - slope).max(0.0) } else { slope.max(0.0) };
    Ok(Measurement::new(value).remark(remark).evidence(Evidence::Series {
        abscissa: "r/M, 1/s",
        ordinate: "force evaluations",
        points,
    }))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a case that cannot be measured has failed")]
mod tests {
    use super::*;

    #[test]
    fn orders_by_rule_are_borne_out_whatever_the_seed() {
        let case = CASES.iter().find(|case| case.id == "S7").unwrap();
        // The last two once fell on steps outside the asymptotic range.
        for seed in [1, 2, 3, 4, u64::MAX - 1, u64::MAX] {
            let measured = (case.measure)(Subject { method: None, seed }).unwrap();
            assert!(measured.value <= case.limit, "seed {seed}: {}", measured.remark);
        }
    }
}
