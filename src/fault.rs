//! Seeded faults: does the suite notice when the program is wrong?
//!
//! `fault!` stands where a formula could be wrong in a way that people do get it wrong. It expands to
//! the right expression alone. Only with the cargo feature `faults`, which is for tests and nothing else, does it also
//! hold the wrong one, taken while that fault is active; `tests/seeded_faults.rs` activates each in turn and demands
//! that a claim of the shipped suite fails.
//!
//! The reference of 50 digits ([`crate::physics::reference`]) holds no fault: it is the ruler.

/// The right expression; with the feature `faults`, the wrong one while the fault `$id` is active.
#[cfg(not(feature = "faults"))]
macro_rules! fault {
    ($id:literal, $right:expr, $wrong:expr $(,)?) => {
        $right
    };
}

/// The right expression; with the feature `faults`, the wrong one while the fault `$id` is active.
#[cfg(feature = "faults")]
macro_rules! fault {
    ($id:literal, $right:expr, $wrong:expr $(,)?) => {
        if $crate::fault::is_active(const { $crate::fault::index_of($id) }) { $wrong } else { $right }
    };
}

#[cfg(feature = "faults")]
pub use table::{FAULTS, Fault, Seeded};
#[cfg(feature = "faults")]
pub(crate) use table::{index_of, is_active};

#[cfg(feature = "faults")]
mod table {
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// One seeded fault.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Fault {
        /// Name, as in the macro.
        pub id: &'static str,
        /// File that holds it, below `src/`.
        pub file: &'static str,
        /// What is wrong, one clause.
        pub what: &'static str,
        /// Claims to try first: a part of their ids. The whole suite is tried when none of them fails.
        pub claims: &'static str,
    }

    /// Index in [`FAULTS`] of the active fault; their number while there is none.
    static ACTIVE: AtomicUsize = AtomicUsize::new(FAULTS.len());

    /// Whether fault number `index` is active. All threads see it: it is set before the suite starts its own.
    #[inline(always)]
    pub(crate) fn is_active(index: usize) -> bool {
        ACTIVE.load(Ordering::Relaxed) == index
    }

    /// Index of the fault `id`; one that the table lacks does not compile.
    pub(crate) const fn index_of(id: &str) -> usize {
        let mut index = 0;
        while index < FAULTS.len() {
            if is_same(FAULTS[index].id.as_bytes(), id.as_bytes()) {
                return index;
            }
            index += 1;
        }
        panic!("no such fault in the table")
    }

    const fn is_same(a: &[u8], b: &[u8]) -> bool {
        if a.len() != b.len() {
            return false;
        }
        let mut i = 0;
        while i < a.len() {
            if a[i] != b[i] {
                return false;
            }
            i += 1;
        }
        true
    }

    /// A fault that is active for as long as this lives. One at a time, for the whole process.
    #[derive(Debug)]
    pub struct Seeded(());

    impl Seeded {
        /// Activates `fault`.
        pub fn activate(fault: &Fault) -> Self {
            let index = index_of(fault.id);
            let before = ACTIVE.swap(index, Ordering::SeqCst);
            assert!(before == FAULTS.len(), "fault {before} is active when {index} comes");
            Self(())
        }
    }

    impl Drop for Seeded {
        fn drop(&mut self) {
            ACTIVE.store(FAULTS.len(), Ordering::SeqCst);
        }
    }

    const fn fault(id: &'static str, file: &'static str, what: &'static str, claims: &'static str) -> Fault {
        Fault { id, file, what, claims }
    }

    /// Every fault, by file.
    #[rustfmt::skip]
    pub const FAULTS: &[Fault] = &[
        fault("drag-sign", "physics/stage.rs", "drag pushes instead of slowing", "invariant/"),
        fault("crater-radii", "physics/scene.rs", "k d with the radius for d", "closed-form/50-digits"),
        fault("area", "physics/scene.rs", "pi d²/2 for the area in P", "closed-form/50-digits"),
        fault("nose-left-out", "physics/scene.rs", "Q without N*", "closed-form/50-digits"),
        fault("c-not-continuous", "physics/scene.rs", "c from the static force alone, so that the force jumps at k d", "closed-form/50-digits"),
        fault("c-at-impact", "physics/scene.rs", "c from the force at V0 in place of V1", "closed-form/50-digits"),
        fault("layer-at-crater-end", "physics/scene.rs", "> for >= : the layer that ends at k d gives c", "stated/"),
        fault("ndrc-ignored", "physics/scene.rs", "the criterion ndrc takes x = H all the same", "eq15/ndrc"),
        fault("default-k", "physics/scene_file.rs", "k = 1 where the scene gives none", "stated/"),
        fault("nose-ogive", "physics/nose.rs", "sign of the second term of the ogive", "nose/"),
        fault("nose-cone", "physics/nose.rs", "height over the radius for height over the diameter", "nose/"),
        fault("nose-cap", "physics/nose.rs", "1/(4 psi²) for 1/(8 psi²)", "nose/"),
        fault("nose-height-ogive", "physics/nose.rs", "1/2 for 1/4 in the height of an ogive", "nose/"),
        fault("nose-height-cap", "physics/nose.rs", "the other side of the sphere", "nose/"),
        fault("eq14-72", "physics/semi_empirical.rs", "82.6 for 72 in Eq. 14", "stated/"),
        fault("eq11-as-printed", "physics/semi_empirical.rs", "I outside the root, as Eq. 11 is printed", "small-impact/no-drag"),
        fault("eq12-offset", "physics/semi_empirical.rs", "k for k/2 in Eq. 12", "small-impact/no-drag"),
        fault("eq12-inverse", "physics/semi_empirical.rs", "k for k/2 where Eq. 12 is inverted", "eq15/"),
        fault("approach-half", "physics/semi_empirical.rs", "1/N for 1/(2 N) in the approach to Eq. 11", "small-impact/approach-constant/crater"),
        fault("approach-pi", "physics/semi_empirical.rs", "pi left out of the approach to Eq. 12", "small-impact/approach-constant"),
        fault("ndrc-3.19", "physics/semi_empirical.rs", "3.91 for 3.19", "eq15/"),
        fault("ndrc-0.718", "physics/semi_empirical.rs", "0.781 for 0.718", "eq15/"),
        fault("ndrc-wrong-root", "physics/semi_empirical.rs", "the larger root of the quadratic", "eq15/"),
        fault("ndrc-1.32", "physics/semi_empirical.rs", "1.23 for 1.32", "eq15/"),
        fault("ndrc-1.24", "physics/semi_empirical.rs", "1.42 for 1.24", "eq15/"),
        fault("eq15-2.222", "physics/semi_empirical.rs", "2.221, as it should round, for the printed 2.222", "eq15/jump"),
        fault("eq15-0.128", "physics/semi_empirical.rs", "0.182 for the printed 0.128", "eq15/printed"),
        fault("eq15-joint", "physics/semi_empirical.rs", "the printed first branch to H/d = 3.2", "eq15/"),
        fault("group-impact", "physics/groups.rs", "I without S", "small-impact/no-drag"),
        fault("group-geometry", "physics/groups.rs", "N with the area pi d²/4 for d²", "small-impact/approach-constant"),
        fault("group-energy", "physics/groups.rs", "E/(d² fc) for E/(d³ fc)", "eq15/ndrc"),
        fault("exit-energy-factor", "physics/exit_energy.rs", "F/M for 2 F/M in what a stop lacks to the exit", "agreement/critical-velocity"),
        fault("exit-energy-sign", "physics/exit_energy.rs", "the drag grows what is carried to the exit", "margin/"),
        fault("exit-margin-speed", "physics/exit_energy.rs", "V_r/V0 for its square", "margin/"),
        fault("exit-energy-series", "physics/exit_energy.rs", "a coefficient of the series of (y + expm1(-y))/y²", ""),
        fault("crater-end-unnamed", "physics/event.rs", "the end of the crater counts as any stage end", "closed-form/50-digits"),
        fault("atan2-swapped", "physics/closed_form.rs", "arguments of atan2 swapped", "closed-form/50-digits"),
        fault("half-period", "physics/closed_form.rs", "half a period for a quarter at rest in the crater", "closed-form/50-digits/crater"),
        fault("depth-log1p", "physics/closed_form.rs", "ln(u) for log1p(u)", "closed-form/50-digits"),
        fault("tunnel-time", "physics/closed_form.rs", "sqrt(P) for sqrt(P Q) in the tunnel time", "closed-form/50-digits"),
        fault("decay-mean", "physics/closed_form.rs", "the mean of a decay by its end", "closed-form/50-digits"),
        fault("crater-speed", "physics/closed_form.rs", "sign of Q (k d - x)(k d + x)", "closed-form/50-digits"),
        fault("spring-time", "physics/closed_form.rs", "a sign in the time through a loaded spring", "agreement/"),
        fault("slow-rate", "physics/closed_form.rs", "l2 = g - m, which cancels, for w²/(g + m)", "agreement/"),
        fault("critical-drag", "physics/closed_form.rs", "V_c without the drag that acts while the crater forms", "agreement/critical-velocity"),
        fault("critical-half", "physics/closed_form.rs", "k d P for k d P/2 in E_c", "agreement/critical-velocity"),
        fault("critical-in-crater", "physics/closed_form.rs", "V_c of a target thinner than k d as if without drag", "stated/|agreement/critical-velocity"),
        fault("start-half-step", "integrators/central_difference.rs", "V(-1/2) = V0 + dt/2 a(0)", "discrete/"),
        fault("kick-next-step", "integrators/central_difference.rs", "dt(i+1) for the mean of dt(i) and dt(i+1)", "order/unequal"),
        fault("kick-last-step", "integrators/central_difference.rs", "dt(i) for dt(i+1) in the way", "order/unequal"),
        fault("running-sum-time", "integrators/central_difference.rs", "time as a running sum", "scheme/clock"),
        fault("lag-removed", "integrators/central_difference.rs", "the lagged rule looks ahead", "order/drag/lagged"),
        fault("lag-added", "integrators/central_difference.rs", "the centred rule takes the lagged velocity", "order/drag/second-order-rules/landed"),
        fault("centred-quadratic", "integrators/central_difference.rs", "2 for 4 in the discriminant", "order/drag/second-order-rules/landed"),
        fault("predicted-whole-step", "integrators/central_difference.rs", "a whole step ahead for half a step", "order/drag/second-order-rules/landed"),
        fault("landed-one-force", "integrators/central_difference.rs", "the force before a landing for both half steps around it", "order/jump/landed"),
        fault("landed-whole-step", "integrators/central_difference.rs", "a landing takes the time of a whole step", "order/jump/landed"),
        fault("rest-not-located", "integrators/central_difference.rs", "rest at the end of its step where it is to be located", "order/crater/located"),
        fault("parabola-half", "integrators/central_difference.rs", "factor 1/2 of the parabola inside a step", "crater-constant"),
        fault("passage-wrong-root", "integrators/central_difference.rs", "the passage on the way back", "order/drag/second-order-rules/interpolated"),
        fault("velocity-not-interpolated", "integrators/central_difference.rs", "the velocity of the step end at a place inside the step", "order/drag/second-order-rules/interpolated"),
        fault("rest-half-step-late", "integrators/central_difference.rs", "rest tested on V(i-1/2)", "order/crater|lagged-constant|crater-constant"),
        fault("step-end-depth", "integrators/central_difference.rs", "the depth after the turn for the deepest", ""),
        fault("stability-limit", "integrators/central_difference.rs", "w dt < 1", "stability-limit"),
        fault("energy-factor", "integrators/energy.rs", "F/M for 2 F/M in dW/dx", "agreement/energy"),
        fault("energy-time-power", "integrators/energy.rs", "a coefficient of the series of 1/V", "agreement/energy"),
        fault("energy-drag", "integrators/energy.rs", "the drag of x for that of W", "agreement/energy"),
        fault("taylor-index", "integrators/taylor.rs", "v[k-i-1] for v[k-i] in the convolution", "agreement/taylor"),
        fault("taylor-middle-term", "integrators/taylor.rs", "the middle term of the convolution twice", "agreement/taylor"),
        fault("taylor-coefficient", "integrators/taylor.rs", "k + 2 for k + 1 in the coefficients of x", "agreement/taylor"),
        fault("stage-end-inclusive", "integrators/taylor.rs", "< for <= at a stage end such as k d", "agreement/taylor"),
        fault("events-swapped", "integrators/taylor.rs", "the exit listed as rest", "events/order"),
        fault("passage-velocity", "integrators/locate.rs", "factor 1/2 of V'' left out at a passage", "agreement/taylor"),
        fault("rest-depth", "integrators/locate.rs", "factor 1/2 of V' left out on the way to rest", "agreement/taylor"),
        fault("kink-derivative-kept", "integrators/diffsol.rs", "the derivative in front of a boundary kept for the first step behind it", "agreement/tsit45"),
        fault("event-at-step-end", "integrators/diffsol.rs", "an event at the end of its step", "agreement/tsit45"),
        fault("fit-slope", "studies/order.rs", "the slope over log2 of the step", "order/drag/second-order-rules/landed"),
        fault("error-not-relative", "studies/error.rs", "absolute errors", "agreement/"),
        fault("formal-order", "studies/formal_order.rs", "a jump of the force said not to matter", "order/jump"),
        fault("gci-safety-factor", "studies/grid_convergence.rs", "1 for 1.25 in the GCI", "grid-convergence"),
        fault("richardson-sign", "studies/grid_convergence.rs", "extrapolation away from the limit", "grid-convergence"),
        fault("three-grid-order", "studies/grid_convergence.rs", "e21/e32 for e32/e21", "grid-convergence"),
        fault("condition-left-out", "studies/random_scenes.rs", "no condition number", "closed-form/50-digits/random"),
        fault("critical-energy", "studies/critical_velocity.rs", "M V_c² for M V_c²/2", "eq15/ndrc"),
    ];
}
