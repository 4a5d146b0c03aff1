//! What a flight may allocate: nothing, counted by an allocator of its own.
//!
//! Not among those that allocate nothing, and why: diffsol's methods (the library keeps its states on the heap), a flight
//! whose trajectory is asked for (a list of steps), a flight that ends at impact (it has a note that says so), a scene
//! of more stages or events than a crater and a tunnel have, the search for a critical velocity (argmin's executor), and
//! [`Batch`], whose answers are a list: it allocates that list and one block, however many scenes fly.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use argmin::core::{CostFunction, Executor, IterState};
use argmin::solver::brent::BrentRoot;
use penetrode::exchange::scene_file::SHIPPED;
use penetrode::integrators::lanes::Batch;
use penetrode::integrators::{ClosedForm, Detail, Energy, Integrator, Taylor};
use penetrode::physics::{Problem, Scene};
use penetrode::studies::critical_velocity;
use penetrode::studies::random_scenes::Generator;

/// The system's allocator, which also counts.
struct Counting;

thread_local! {
    /// Allocations of this thread: other tests run beside it.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that is ending has no counter any more, and counts for nobody.
    let _ = ALLOCATIONS.try_with(|allocations| allocations.set(allocations.get() + 1));
}

// SAFETY: every request goes to the system's allocator as it came, and its answer goes back as it is; the counter is a
// plain number of the thread, without a destructor, so that counting neither allocates nor calls back in here.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often `work` asks for memory, and what it gives.
fn allocations<R>(work: impl FnOnce() -> R) -> (u64, R) {
    let before = ALLOCATIONS.get();
    let result = work();
    (ALLOCATIONS.get() - before, result)
}

fn shipped(name: &str) -> Scene {
    let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap_or_else(|| panic!("no scene {name}")).1;
    Scene::from_toml(text, name).unwrap_or_else(|error| panic!("{error}"))
}

/// The scenes of the comparison with other solvers, and a thousand random ones.
fn problems() -> Vec<Problem> {
    let named = ["crater", "tunnel", "perforate", "graze"].map(|name| shipped(name).problem().unwrap());
    let mut generator = Generator::new(1, "allocations");
    named.into_iter().chain((0..1000).map(|_| generator.next_scene().problem().unwrap())).collect()
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| Vec::<u8>::with_capacity(8)).0, 1);
    assert_eq!(allocations(|| Box::new(1.0)).0, 1);
    assert_eq!(allocations(|| 1.0).0, 0);
}

#[test]
fn a_flight_with_all_its_events_allocates_nothing() {
    let problems = problems();
    for method in [&Taylor::default() as &dyn Integrator, &Energy::default(), &ClosedForm] {
        for (index, problem) in problems.iter().enumerate() {
            for detail in [Detail::End, Detail::Events] {
                let (count, flight) = allocations(|| method.solve(problem, detail));
                assert_eq!(count, 0, "{} on problem {index} with {detail:?}: {flight:?}", method.name());
                assert!(flight.unwrap().end.time > 0.0);
            }
        }
    }
}

#[test]
fn a_scene_resolves_without_allocating() {
    for name in ["crater", "tunnel", "perforate", "graze"] {
        let scene = shipped(name);
        assert_eq!(allocations(|| scene.resolve(300.0).unwrap()).0, 0, "{name}");
    }
}

/// Where x = 1, for argmin alone.
struct Line;

impl CostFunction for Line {
    type Param = f64;
    type Output = f64;

    fn cost(&self, x: &f64) -> Result<f64, argmin::core::Error> {
        Ok(x - 1.0)
    }
}

#[test]
fn a_critical_velocity_allocates_what_the_root_finder_of_argmin_does_and_nothing_for_its_flights() {
    let alone = || {
        let configure = |state: IterState<f64, (), (), (), (), f64>| state.max_iters(100);
        let solver = BrentRoot::new(0.0, 3.0, 0.0);
        Executor::new(Line, solver).configure(configure).ctrlc(false).timer(false).run().unwrap();
    };
    let library = allocations(alone).0;
    for (name, velocity) in [("perforate", 400.0), ("graze", 300.0), ("paper-slab", 200.0)] {
        let scene = Scene { velocity: Some(velocity), ..shipped(name) };
        for method in [&Taylor::default() as &dyn Integrator, &Energy::default(), &ClosedForm] {
            let (count, critical) = allocations(|| critical_velocity::of_scene(&scene, method).unwrap());
            // More flights than one, or a count of none would say nothing of them.
            assert!(critical.evaluations >= 3, "{critical:?}");
            assert!(count <= library, "{} on {name}: {count} allocations, argmin alone {library}", method.name());
        }
    }
    assert!(library < 10, "{library}");
}

#[test]
fn lanes_allocate_their_answers_and_one_block_however_many_scenes_fly() {
    let problems = problems();
    let batch = Batch::new();
    let few = allocations(|| batch.solve(&problems[..10]));
    // Three blocks of lanes, one after the other in the same memory.
    let many: Vec<Problem> = problems.iter().cycle().take(3000).cloned().collect();
    let many = allocations(|| batch.solve(&many));
    assert_eq!((few.0, few.1.len(), many.1.len()), (many.0, 10, 3000));
    assert!(many.0 <= 2, "{}", many.0);
}
