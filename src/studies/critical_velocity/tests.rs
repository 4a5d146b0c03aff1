use super::*;
use crate::integrators::{Detail, Energy, Flight, Margin};
use crate::physics::closed_form::critical;
use crate::physics::{CraterStiffness, Stage};

/// Crater and tunnel: mass, k d, P, Q, c if given, H.
#[derive(Clone, Copy, Debug)]
struct Slab {
    mass: f64,
    kd: f64,
    p: f64,
    q: f64,
    c: Option<f64>,
    h: f64,
}

const SLAB: Slab = Slab { mass: 2.0, kd: 0.1, p: 848_230.0, q: 3.25, c: None, h: 0.4 };

impl Slab {
    #[expect(clippy::unnecessary_wraps, reason = "it stands for a scene, which may refuse")]
    fn at(self, v0: f64) -> Result<Problem, ResolveError> {
        let Self { mass, kd, p, q, c, h } = self;
        let tunnel = Stage::tunnel(p, q);
        let crater = c.map_or_else(|| Stage::continuous_crater(kd, &tunnel, mass, v0), |c| Stage::crater(c, kd));
        Ok(Problem::crater_and_tunnel(mass, v0, Some(crater), tunnel).with_exit(h))
    }

    /// By the closed form, which is compared with 50 digits in its own tests.
    fn critical(self) -> f64 {
        let stiffness = self.c.map_or(CraterStiffness::Continuous, CraterStiffness::Given);
        critical(&self.at(1.0).unwrap(), stiffness).unwrap().velocity
    }
}

fn stages_at(stages: &[Stage], exit: f64) -> impl Fn(f64) -> Result<Problem, ResolveError> {
    move |v0| Ok(Problem::of_stages(1.0, v0, stages.iter().copied()).with_exit(exit))
}

fn constant(p: f64, q: f64, end: f64) -> Stage {
    Stage { end, ..Stage::tunnel(p, q) }
}

/// The slab with viscosity in its tunnel.
fn viscous(v0: f64) -> Result<Problem, ResolveError> {
    let mut problem = SLAB.at(v0)?;
    problem.stages[1].viscosity = 1.0;
    Ok(problem)
}

/// An integrator that only knows a margin.
struct Oracle<F>(F);

impl<F: Fn(&Problem) -> (f64, Option<f64>)> Integrator for Oracle<F> {
    fn name(&self) -> &'static str {
        "oracle"
    }

    fn solve(&self, _: &Problem, _: Detail) -> Result<Flight, IntegrationError> {
        Err(IntegrationError::Refused { method: "oracle", why: "it knows the margin only".to_owned() })
    }

    fn exit_margin(&self, problem: &Problem) -> Result<Option<Margin>, IntegrationError> {
        let (value, error) = (self.0)(problem);
        Ok(Some(Margin { value, error, cost: Cost::default() }))
    }
}

fn search(slab: Slab, integrator: &dyn Integrator) -> Result<CriticalVelocity, CriticalError> {
    critical_velocity(|v0| slab.at(v0), integrator)
}

/// True margin of the slab, affine in V0².
fn true_margin(problem: &Problem) -> f64 {
    Energy::new().exit_margin_in(problem).unwrap().unwrap().0
}

#[test]
fn critical_velocity_agrees_with_the_closed_form_within_its_bar_and_twelve_flights() {
    let (mut worst, mut flights, mut share) = (0.0_f64, 0, 0.0_f64);
    let mut cases = 0;
    for h in [1e-3, 0.05, 0.1, 0.1 + 1e-9, 0.15, 0.4, 1.0, 3.0, 10.0] {
        for q in [0.0, 1e-6, 0.3, 3.25, 20.0] {
            for c in [None, Some(4e6), Some(2e7)] {
                for mass in [0.1, 2.0, 500.0] {
                    let slab = Slab { mass, q, c, h, ..SLAB };
                    if 2.0 * q * h / mass > 600.0 {
                        continue;
                    }
                    let found = search(slab, &Energy::new()).unwrap_or_else(|e| panic!("{slab:?}: {e}"));
                    let exact = slab.critical();
                    let error = (found.velocity - exact).abs();
                    // The drag exponent y = 2 q h/M is a condition number of V_c² once it is above one.
                    let condition = (2.0 * q * h / mass).max(1.0);
                    // The closed form has its own few ulp.
                    let bar = found.error_bar.unwrap() + 4.0 * f64::EPSILON * condition * exact;
                    assert!(error <= bar, "{slab:?}: {error:e} over {bar:e}");
                    worst = worst.max(error / exact / condition);
                    share = share.max(found.error_bar.unwrap() / exact / condition);
                    // Beyond, V_c is e^50 times the speed that the static work alone would ask for.
                    if condition < 100.0 {
                        flights = flights.max(found.evaluations);
                    }
                    assert!(found.evaluations <= 16, "{slab:?}");
                    cases += 1;
                    assert!((found.energy / (0.5 * mass * found.velocity.powi(2)) - 1.0).abs() < 1e-15, "{slab:?}");
                }
            }
        }
    }
    println!("{cases} cases: worst error {worst:e}, largest bar {share:e}, most flights {flights}");
    assert!(worst < 1e-13 && share < 1e-13 && flights <= 12);
}

#[test]
fn a_slab_that_takes_nearly_all_of_v0_is_searched_in_time_or_over_depth() {
    // e^y times the static work per mass is V_c², e^130 of it at last.
    for h in [12.0, 20.0, 40.0] {
        let slab = Slab { h, ..SLAB };
        let (exact, drag) = (slab.critical(), 2.0 * slab.q * h / slab.mass);
        assert!(drag > 38.0);
        let integrators: [&dyn Integrator; 2] = [&Energy::new(), &Taylor::default()];
        for integrator in integrators {
            let found = search(slab, integrator).unwrap();
            assert!((found.velocity / exact - 1.0).abs() < 1e-15 * drag, "{found:?} and not {exact}");
            assert!((found.velocity - exact).abs() < found.error_bar.unwrap(), "{found:?} and not {exact}");
        }
    }
}

#[test]
fn an_error_bar_that_leaves_no_digit_is_undecided_and_not_a_number() {
    // An error bound of some ulp of V0², where the drag takes 1e17 of that.
    let slab = Slab { h: 12.0, ..SLAB };
    let coarse = Oracle(|problem: &Problem| (true_margin(problem), Some(1e-15)));
    let refusal = search(slab, &coarse).unwrap_err();
    let CriticalError::Undecided { velocity, error_bar, .. } = refusal else { panic!("{refusal}") };
    assert!(2.0 * error_bar >= velocity, "{velocity} {error_bar}");
}

/// Layers of F = r V in front of a static one, behind one, and alone: by hand from dV/dx = -r/M.
#[test]
fn layers_that_only_slow_have_a_critical_velocity_though_slower_flights_never_end() {
    let slowing = |end| Stage { viscosity: 1.0, end, ..Stage::tunnel(0.0, 0.0) };
    for (stages, exact) in [
        (vec![slowing(0.5), constant(0.1, 0.0, f64::INFINITY)], 0.5 + 0.1_f64.sqrt()),
        (vec![constant(1.0, 0.0, 0.5), slowing(f64::INFINITY)], 1.25_f64.sqrt()),
        (vec![slowing(f64::INFINITY)], 1.0),
    ] {
        let at = stages_at(&stages, 1.0);
        for integrator in [&Taylor::default() as &dyn Integrator, &crate::integrators::ClosedForm] {
            let found = critical_velocity(&at, integrator).unwrap();
            let (error, bar) = ((found.velocity - exact).abs(), found.error_bar.unwrap());
            assert!(error <= bar && error < 1e-14, "{} {stages:?}: {found:?} and not {exact}", integrator.name());
        }
    }
}

#[test]
fn usual_slab_takes_four_flights() {
    let found = search(SLAB, &Energy::new()).unwrap();
    assert_eq!(found.evaluations, 4);
    assert_eq!(found.note, "");
    assert!(found.bracket.0 < found.velocity && found.velocity < found.bracket.1);
    assert!(found.cost.force_evaluations > 0);
}

/// Of a looser method, and of noise within the error bound, different at every speed, as adaptive steps make it: it
/// costs neither flights nor truth.
#[test]
fn bar_of_a_loose_or_a_noisy_method_holds_at_no_more_flights_than_it_needs() {
    let exact = SLAB.critical();
    let holds = |integrator: &dyn Integrator, size: f64| {
        let found = search(SLAB, integrator).unwrap();
        let (error, bar) = ((found.velocity - exact).abs(), found.error_bar.unwrap());
        assert!(error <= bar, "{size:e}: {error:e} over {bar:e}");
        assert!(bar < 10.0 * size * exact + 1e-12 && found.evaluations <= 12, "{size:e}: {found:?}");
    };
    for size in [1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2] {
        holds(&Energy::with_rtol(size).unwrap(), size);
        let noisy = |problem: &Problem| true_margin(problem) + size * (problem.impact_speed * 1e9).sin();
        holds(&Oracle(|problem: &Problem| (noisy(problem), Some(size))), size);
    }
}

#[test]
fn tolerance_asked_for_is_kept_and_saves_flights() {
    // Bent, so that the root finder has something to save.
    let bent = Oracle(|problem: &Problem| {
        let u = problem.impact_speed.powi(2);
        ((u - 1e5 - 100.0 * u.sqrt()) / u, Some(1e-16))
    });
    let exact = 50.0 + (2500.0_f64 + 1e5).sqrt();
    let fine = critical_velocity(viscous, &bent).unwrap();
    assert!((fine.velocity / exact - 1.0).abs() < 1e-15, "{fine:?}");
    assert!(fine.evaluations <= 15, "{}", fine.evaluations);
}

/// Objectives that change their sign at V_c and are no margin: these made `BrentRoot` "converge" at an end of its bracket.
#[test]
fn an_objective_that_is_no_margin_is_refused() {
    for bar in [None, Some(1e-15)] {
        let refused = |objective: fn(f64) -> f64| {
            let refusal =
                search(SLAB, &Oracle(|problem: &Problem| (objective(true_margin(problem)), bar))).unwrap_err();
            assert!(!refusal.is_usage(), "{refusal}");
            refusal
        };
        let of_outcome = refused(f64::signum);
        assert!(matches!(of_outcome, CriticalError::Jump { .. }), "{of_outcome}");
        // The depth capped at the exit, and its mirror image, the residual energy that is zero for every stop.
        let capped = refused(|margin| margin.min(0.0));
        let CriticalError::NoBracket { low, high } = capped else { panic!("{capped}") };
        assert!(low.w < 0.0 && high.w == 0.0);
        assert!(capped.to_string().contains(&low.to_string()) && capped.to_string().contains(&high.to_string()));
        let residual = refused(|margin| margin.max(0.0));
        let CriticalError::NoBracket { low, high } = residual else { panic!("{residual}") };
        assert!(low.w == 0.0 && high.w > 0.0);
        // One sign throughout.
        let never = refused(|_| -0.5);
        let CriticalError::NoBracket { low, high } = never else { panic!("{never}") };
        assert!(low.velocity() < high.velocity() && low.w < 0.0 && high.w < 0.0);
        let nan = refused(|_| f64::NAN);
        assert!(matches!(nan, CriticalError::NotFinite { .. }), "{nan}");
    }
    // Within the bracket only, where argmin would call it convergence.
    let exact = SLAB.critical();
    let inside = Oracle(|problem: &Problem| {
        let near = (problem.impact_speed / exact - 1.0).abs() < 1e-8;
        (if near { f64::NAN } else { true_margin(problem) }, None)
    });
    let refusal = search(SLAB, &inside).unwrap_err();
    assert!(matches!(refusal, CriticalError::NotFinite { velocity, .. } if (velocity / exact - 1.0).abs() < 1e-8));
}

/// The residual velocity with its sign has an infinite slope at `V_c`; a scheme that sees the exit at a step's end makes a
/// staircase of W over V0. Their sign change is right, and no bar is invented.
#[test]
fn a_sign_change_that_is_no_simple_root_is_located_without_a_bar() {
    let root: fn(f64, f64) -> f64 = |margin, _| margin.abs().sqrt().copysign(margin);
    // The floor changes sign at W = 0.
    let staircase = |margin: f64, u: f64| ((margin * u / 300.0).floor() * 300.0 + 40.0) / u;
    for (objective, limit, evaluations) in [(root, 1e-13, u64::MAX), (staircase, 1e-12, 79)] {
        let oracle = Oracle(|problem: &Problem| (objective(true_margin(problem), problem.impact_speed.powi(2)), None));
        let found = search(SLAB, &oracle).unwrap();
        assert!((found.velocity / SLAB.critical() - 1.0).abs() < limit, "{} {}", found.velocity, SLAB.critical());
        assert_eq!(found.error_bar, None);
        assert!(u64::from(found.evaluations) <= evaluations, "{}", found.evaluations);
    }
}

#[test]
fn a_search_without_an_end_says_so() {
    // The slab of a kilometre: e^y leaves the range of the numbers.
    let refusal = search(Slab { h: 1000.0, ..SLAB }, &Energy::new()).unwrap_err();
    assert!(!refusal.is_usage() && refusal.to_string().contains("no critical velocity up to"), "{refusal}");
    let refusal = within(3, |v0| SLAB.at(v0), &Energy::new()).unwrap_err();
    assert!(matches!(refusal, CriticalError::NotConverged { flights: 3, .. }), "{refusal}");
}

#[test]
fn without_a_far_side_there_is_none_and_without_thickness_it_is_zero_and_takes_no_flight() {
    let refusal = search(Slab { h: f64::INFINITY, ..SLAB }, &Energy::new()).unwrap_err();
    assert!(refusal == CriticalError::NoExit && refusal.is_usage());
    let found = search(Slab { h: 0.0, ..SLAB }, &Energy::new()).unwrap();
    assert_eq!((found.velocity, found.energy, found.evaluations, found.error_bar), (0.0, 0.0, 0, Some(0.0)));
    assert!(!found.note.is_empty());
}

#[test]
fn errors_of_scene_and_flight_come_through() {
    let refusal = critical_velocity(|_| Err(ResolveError::NoStage), &Energy::new()).unwrap_err();
    assert!(refusal.is_usage() && refusal.to_string().contains("the scene has no stage"), "{refusal}");
    let refusal = critical_velocity(viscous, &Energy::new()).unwrap_err();
    assert!(refusal.is_usage() && matches!(refusal, CriticalError::Flight { .. }), "{refusal}");
}

#[test]
fn target_that_only_drives_or_drags_is_perforated_at_any_speed() {
    let end = f64::INFINITY;
    for stages in [vec![constant(-10.0, 0.0, end)], vec![constant(-10.0, 2.0, end)], vec![constant(0.0, 2.0, end)]] {
        let found = critical_velocity(stages_at(&stages, 2.0), &Energy::new()).unwrap();
        assert_eq!((found.velocity, found.energy), (0.0, 0.0), "{stages:?}");
        assert!(found.error_bar.unwrap() < 1e-12 && !found.note.is_empty(), "{found:?}");
    }
}

/// A drive before a barrier lowers `V_c`, a drive behind it does not; one that outdoes the barrier leaves none.
#[test]
fn barrier_decides_the_critical_velocity_of_a_driven_target() {
    let search = |stages: &[Stage]| critical_velocity(stages_at(stages, 3.0), &Energy::new());
    let (drive, barrier) = (constant(-4.0, 0.0, 1.0), constant(10.0, 0.0, 2.0));
    let found = search(&[drive, barrier, constant(-100.0, 0.0, f64::INFINITY)]).unwrap();
    assert!((found.velocity - 12.0_f64.sqrt()).abs() < 1e-14, "{found:?}");
    assert!(found.evaluations <= 12);
    let strong = constant(-20.0, 0.0, 1.0);
    let found = search(&[strong, barrier, constant(0.0, 0.0, f64::INFINITY)]).unwrap();
    assert_eq!(found.velocity, 0.0);
}

/// V_c of a barrier, and of a viscous stage, in front of what only drags or drives: `sqrt(2 P L/M)` and `r L/M`.
#[test]
fn a_stage_that_decides_has_its_critical_velocity_whatever_creeps_or_drives_behind_it() {
    let force = |static_force: f64, end: f64| constant(static_force, 0.0, end);
    let slowing = |viscosity: f64, end: f64| Stage { viscosity, ..force(0.0, end) };
    let barrier = force(2_729_150.0, 13.801_015_898_614_65);
    let dragging = constant(0.0, 0.133_084, f64::INFINITY);
    let damped = Stage { viscosity: 0.01, ..force(3.0, f64::INFINITY) };
    for (mass, exit, stages, exact) in [
        (
            0.001_865_34,
            0.015_983_208,
            vec![slowing(4.554, 0.004_114_068_643_424_028), force(-0.110_194, f64::INFINITY)],
            10.043_996_591_588_142,
        ),
        (
            0.601_95,
            586.485_26,
            vec![barrier, dragging.until(1000.0), damped],
            (2.0 * barrier.static_force * barrier.end / 0.601_95).sqrt(),
        ),
        (0.002_144_98, 0.036_811_3, vec![force(-3.608_37e-5, f64::INFINITY)], 0.0),
    ] {
        let at = |v0| Ok(Problem::of_stages(mass, v0, stages.iter().copied()).with_exit(exit));
        let found = critical_velocity(at, &Taylor::default()).unwrap();
        let off = (found.velocity - exact).abs();
        assert!(off <= 1e-12 * exact, "{found:?}, {exact}");
        assert!(
            found.error_bar.unwrap() <= (1e-9 * exact).max(1e-15) && off <= found.error_bar.unwrap() + 1e-15 * exact,
            "{found:?}"
        );
    }
}

#[test]
fn what_is_advised_is_an_option_of_the_method_that_was_asked() {
    for name in MethodName::ALL {
        let advised = remedy(name.name());
        assert_eq!(advised.contains("--rtol"), name.accuracy() == Accuracy::Tolerance, "{name}: {advised}");
        assert_eq!(advised.contains("--dt"), name.accuracy() == Accuracy::Step, "{name}: {advised}");
        assert!(!advised.contains(&format!("--method {name}")), "{name}: {advised}");
    }
}
