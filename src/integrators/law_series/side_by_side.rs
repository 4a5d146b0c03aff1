//! How are many flights with laws of their own solved at once? Side by side: one pass over the steps of an expression makes the
//! series of all of them.
//!
//! The flights of one group go through a stage together, each by its own steps. Before each step the series that it asks for first is
//! made for all that ask for it in the same way; everything else a flight does alone. So an answer depends on nothing but its problem,
//! to the last bit.
//!
//! Forces of the velocity alone and forces `p(x) + q(x) V²` go by integrals, where one pass serves all places of a step already.

use std::array::from_fn;

use super::{Begun, Form, LawSeries, Local, Made, Path, Walk};
use crate::integrators::flight::{self, Bounded, Course, StageEnd};
use crate::integrators::instructions::{Instructions, Work};
use crate::integrators::outcome::{Detail, Flight, Solved};
use crate::integrators::taylor;
use crate::physics::expression::{Bound, Jets};
use crate::physics::lanes::Lanes;
use crate::physics::{Law, Problem, State};

/// Flights that one pass serves: one vector of the widest kind.
const WIDTH: usize = 8;

/// Flights under way together: where most have ended, few are left for a pass.
const TOGETHER: usize = 32;

/// Flights that must ask for a series in the same way.
const FEWEST: usize = 3;

/// Coefficients of the default method.
const ORDERS: usize = 22;

type Wide = Lanes<WIDTH>;

/// Whether all stages of `problem` have laws of their own, and series solve one of them.
pub(in crate::integrators) fn serves(problem: &Problem) -> bool {
    let law = |stage: usize| problem.laws.of(stage);
    let mut stages = 0..problem.stages.len();
    !problem.laws.is_empty()
        && flight::starts(problem)
        && stages.clone().all(|stage| law(stage).is_some())
        && stages.any(|stage| law(stage).is_some_and(goes_by_series))
}

/// As the default method solves them.
const SERIES: LawSeries = taylor::law_series(f64::EPSILON);

fn goes_by_series(law: &Law) -> bool {
    law.bound().is_some() && (law.end().is_some() || !law.is_of_velocity() && law.by_square_of_v().is_none())
}

/// The flights of those of `problems` that it serves, by the default method, in their order.
pub(in crate::integrators) fn solve(problems: &[Problem], instructions: Instructions) -> Vec<Solved<Flight>> {
    let problems: Vec<&Problem> = problems.iter().filter(|problem| serves(problem)).collect();
    let mut jets = Jets::default();
    let solve = |group: &[&Problem]| Group::new(group, instructions, &mut jets).solve();
    problems.chunks(TOGETHER).flat_map(solve).collect()
}

/// A flight of a group.
struct One<'a> {
    course: Course<'a>,
    /// Stages that it has entered: each ends, or a flight that goes round for ever would.
    entered: usize,
    /// The stage in progress, and where it ends at last (m).
    walk: Option<(Walk<'a, f64, ORDERS>, f64)>,
    /// The step that has begun, and the series that are made for it.
    begun: Option<(Local<f64>, Made<f64, ORDERS>)>,
    /// What it has come to: its exit margin, or why it has none.
    ended: Option<Solved<Option<Bounded>>>,
}

struct Group<'a, 'j> {
    flights: Vec<One<'a>>,
    instructions: Instructions,
    jets: &'j mut Jets<Wide>,
    /// The expression that all flights of the last pass had, and itself side by side.
    shared: Option<(&'a Bound, Bound<Wide>)>,
}

/// A flight, by its place in the group, and how the series goes that it asks for.
type Asked = (usize, Form);

/// The series of a step of all flights, in the making.
struct Making<'b> {
    bound: &'b Bound<Wide>,
    jets: &'b mut Jets<Wide>,
    mass: Wide,
    start: State<Wide>,
    form: Form,
    /// Of time (s), where they go over time.
    unit: Wide,
    path: Option<Path<Wide, ORDERS>>,
}

impl Work for Making<'_> {
    #[inline(always)]
    fn run(&mut self) {
        let Self { bound, jets, mass, start, form, unit, path } = self;
        *path = Some(match *form {
            Form::Velocity(fall) => Path::over_velocity(
                *start,
                *mass,
                fall,
                #[inline(always)]
                |x, v| jets.push_in_place(bound, x, v),
            ),
            Form::Time(_) | Form::Depth(_) => Path::over_time(
                *start,
                *mass,
                *form,
                *unit,
                ORDERS,
                #[inline(always)]
                |x, v| jets.push_in_place(bound, x, v),
            ),
        });
    }
}

impl Path<Wide, ORDERS> {
    /// The path of one `lane`, which goes by `form`, so much time (s) `before` it.
    fn lane(&self, lane: usize, form: Form, before: f64) -> Path<f64, ORDERS> {
        let zero = [0.0; ORDERS];
        let mut path = Path { depth: zero, velocity: zero, time: zero, form, span: 0.0, before };
        let own = [&mut path.depth, &mut path.velocity, &mut path.time];
        for (own, of_all) in own.into_iter().zip([&self.depth, &self.velocity, &self.time]) {
            own.iter_mut().zip(of_all).for_each(|(own, of_all)| *own = of_all.0[lane]);
        }
        path
    }
}

impl<'a, 'j> Group<'a, 'j> {
    fn new(problems: &[&'a Problem], instructions: Instructions, jets: &'j mut Jets<Wide>) -> Self {
        let one = |problem: &&'a Problem| {
            let mut course = Course::new(problem, Detail::Events);
            course.begin(&mut { SERIES });
            One { course, entered: 0, walk: None, begun: None, ended: None }
        };
        Self { flights: problems.iter().map(one).collect(), instructions, jets, shared: None }
    }

    fn solve(mut self) -> Vec<Solved<Flight>> {
        // Those that are behind go first, so that all go through a stage together.
        while let Some(stage) = self.flights.iter().filter(|one| one.ended.is_none()).map(|one| one.course.stage).min()
        {
            let is_there = |one: &&mut One<'_>| one.ended.is_none() && one.course.stage == stage;
            self.flights.iter_mut().filter(is_there).for_each(One::enter);
            while self.flights.iter().any(|one| one.walk.is_some()) {
                self.step();
            }
        }
        self.flights.into_iter().map(One::finish).collect()
    }

    /// One step of each flight that is in its stage.
    fn step(&mut self) {
        self.flights.iter_mut().for_each(One::begin_step);
        // By velocity, and by time for those that velocity takes too short a way.
        for _ in 0..2 {
            let asked = self.flights.iter().enumerate();
            let mut asked: Vec<Asked> = asked.filter_map(|(index, one)| Some((index, one.asks()?))).collect();
            while let Some(first) = asked.first().copied() {
                let (alike, others): (Vec<_>, Vec<_>) =
                    asked.into_iter().partition(|other| self.are_alike(first, *other));
                alike.chunks(WIDTH).filter(|lanes| lanes.len() >= FEWEST).for_each(|lanes| self.make(lanes));
                asked = others;
            }
        }
        self.flights.iter_mut().for_each(One::go_on);
    }

    /// Whether two flights ask for the series of one expression in one way; whether it takes the same steps is seen later.
    fn are_alike(&self, (one, form): Asked, (other, other_form): Asked) -> bool {
        let (Some((one, _)), Some((other, _))) = (&self.flights[one].walk, &self.flights[other].walk) else {
            return false;
        };
        let is_one_form = match (form, other_form) {
            (Form::Velocity(_), Form::Velocity(_)) => one.falling.is_same(&other.falling),
            (Form::Time(_), Form::Time(_)) => true,
            _ => false,
        };
        is_one_form && one.sides == other.sides
    }

    /// Makes the series that these flights ask for.
    fn make(&mut self, asked: &[Asked]) {
        // What is made for lanes without a flight is forgotten.
        let of = |lane: usize| asked.get(lane).or(asked.first()).copied();
        let walk_of = |lane: usize| self.flights[of(lane)?.0].walk.as_ref().map(|(walk, _)| walk);
        let (Some((_, form)), Some(walk)) = (of(0), walk_of(0)) else { return };
        let bounds: [&'a Bound; WIDTH] = from_fn(|lane| walk_of(lane).map_or(walk.bound, |walk| walk.bound));
        let is_one = bounds.iter().all(|bound| std::ptr::eq(*bound, walk.bound));
        let known = self.shared.take().filter(|(one, _)| is_one && std::ptr::eq(*one, walk.bound));
        let Some(bound) = known.map_or_else(|| Bound::in_lanes(bounds), |(_, bound)| Some(bound)) else { return };
        match form {
            Form::Velocity(_) => self.jets.start_falling(&bound, &walk.sides, &walk.falling),
            Form::Time(_) | Form::Depth(_) => self.jets.start(&bound, &walk.sides),
        }
        let lanes = |number: fn(&One<'_>, Form) -> f64| {
            Lanes(from_fn(|lane| of(lane).map_or(f64::NAN, |(index, form)| number(&self.flights[index], form))))
        };
        let mut making = Making {
            start: State {
                time: lanes(|one, _| one.course.state.time),
                depth: lanes(|one, _| one.course.state.depth),
                velocity: lanes(|one, _| one.course.state.velocity),
            },
            mass: lanes(|one, _| one.course.mass),
            unit: lanes(|_, form| if let Form::Time(unit) = form { unit } else { 1.0 }),
            bound: &bound,
            jets: self.jets,
            form,
            path: None,
        };
        self.instructions.run(&mut making);
        let Some(path) = making.path else { return };
        for (lane, (index, form)) in asked.iter().enumerate() {
            let One { course, walk: Some((walk, _)), begun: Some((_, made)), .. } = &mut self.flights[*index] else {
                continue;
            };
            let path = path.lane(lane, *form, course.state.time);
            // A term that vanishes in one lane alone has a series there, and none beside others: that flight makes its own.
            if !path.is_finite() {
                continue;
            }
            let kept = bound.switches().iter().copied().chain(walk.bound.beside().and_then(Result::ok));
            walk.jets.take_lane(self.jets, lane, kept);
            match form {
                Form::Velocity(_) => made.by_velocity = Some(path),
                Form::Time(_) | Form::Depth(_) => made.by_time = Some(path),
            }
        }
        if is_one {
            self.shared = Some((bounds[0], bound));
        }
    }
}

impl One<'_> {
    /// Enters the present stage; one that no series solves is solved whole.
    fn enter(&mut self) {
        let entered = self.enter_stage();
        self.settle(entered);
    }

    fn enter_stage(&mut self) -> Solved<Option<StageEnd>> {
        if self.entered == self.course.problem.stages.len() || !self.course.enters_stage() {
            return Err(self.course.nothing_follows());
        }
        self.entered += 1;
        match self.course.problem.laws.of(self.course.stage) {
            Some(law) if goes_by_series(law) => {
                let limit = self.course.limit()?;
                self.walk = Some((SERIES.walk(&self.course, law)?, limit));
                Ok(None)
            }
            _ => flight::end_of_stage(&mut self.course, &mut { SERIES }).map(Some),
        }
    }

    /// Begins a step of the stage in progress.
    fn begin_step(&mut self) {
        let Some((walk, limit)) = self.walk.as_mut() else { return };
        match walk.begin(&self.course, *limit) {
            Ok(Begun::At(here)) => self.begun = Some((here, Made::default())),
            Ok(Begun::Ended(end)) => self.settle(Ok(Some(end))),
            Err(error) => self.settle(Err(error)),
        }
    }

    /// How the series goes that the step asks for next.
    fn asks(&self) -> Option<Form> {
        let ((walk, limit), (here, made)) = self.walk.as_ref().zip(self.begun.as_ref())?;
        walk.asks(self.course.state, here.force, *limit, made)
    }

    /// Takes the step that has begun.
    fn go_on(&mut self) {
        let (Some((walk, limit)), Some((here, made))) = (self.walk.as_mut(), self.begun.take()) else { return };
        let end = walk.go_on(&mut self.course, *limit, here, made);
        self.settle(end);
    }

    /// What follows from the end of a stage, if it has come to one.
    fn settle(&mut self, end: Solved<Option<StageEnd>>) {
        let Some(end) = end.transpose() else { return };
        self.walk = None;
        let method = &mut { SERIES };
        self.ended = match end.and_then(|end| self.course.arrived(end)) {
            Ok(end) => self.course.leaves_stage(end, method).then(|| {
                let margin = self.course.problem.has_exit().then(|| self.course.margin());
                Ok(self.course.unless_doubted(margin))
            }),
            Err(error) => Some(Err(error)),
        };
    }

    fn finish(self) -> Solved<Flight> {
        let Self { course, ended, .. } = self;
        let unended = || Err(course.nothing_follows());
        let margin = ended.unwrap_or_else(unended)?;
        Ok(course.finish(margin))
    }
}
