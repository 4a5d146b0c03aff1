//! Which slip in which closed form explains the wrong passages? For solvers that go from stage to stage by formulas.
//!
//! Each kind of stage has its formulas, as texts, in the numbers that the solver answers: it enters at the depth x0 with the speed V0,
//! and a distance L and a time T later it has the speed V1. A formula with a slip in it that fits every wrong passage, and no right one
//! contradicts, is the cause.
//! So is a formula for a flight to rest that stands where the stage is passed, and the other way round.

use std::sync::LazyLock;

use super::super::super::slips::{Formula, slips};
use super::{Passage, TERMS, Way};
use crate::physics::Stage;

/// Wrong passages of a kind that a slip must explain, and the part of them: a wrong number may lead elsewhere in the others. Of those that
/// are only supposed to be wrong a greater part.
const ENOUGH: usize = 3;
const MOST: f64 = 0.5;
const MOST_OF_SUPPOSED: f64 = 0.9;
/// Relative difference of what a formula gives from what is answered.
const FITS: f64 = 1e-7;
/// The same of a right passage: less is no contradiction.
const CONTRADICTS: f64 = 1e-5;
/// Passages that a slip explains over the right ones that contradict it, at least.
const FAR_MORE_THAN_RIGHT: usize = 10;

/// Names in formulas before those that they define.
const NAMES: [&str; 10] = ["M", "p", "s", "r", "q", "x0", "V0", "L", "T", "V1"];

/// What a formula gives.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gives {
    /// The distance L.
    Distance,
    /// The time T.
    Time,
    /// The speed V1.
    Speed,
    /// The square of V1, which is nothing at rest: so the distance is found.
    NoSquare,
}

impl Gives {
    fn name(self) -> &'static str {
        match self {
            Self::Distance => "L",
            Self::Time => "T",
            Self::Speed => "V1",
            Self::NoSquare => "V1^2",
        }
    }

    /// Which of depth, time and velocity is found by it: the distance to an end of the stage is known, and gives the time.
    fn quantity(self, way: Way) -> usize {
        match self {
            Self::Distance if way != Way::Rest => 1,
            Self::Distance | Self::NoSquare => 0,
            Self::Time => 1,
            Self::Speed => 2,
        }
    }
}

/// In which passages a formula is used.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Used {
    Always,
    AtRest,
    Through,
}

impl Used {
    fn holds(self, way: Way) -> bool {
        match self {
            Self::Always => true,
            Self::AtRest => way == Way::Rest,
            Self::Through => way != Way::Rest,
        }
    }
}

/// Formulas of one kind of stage, in the order in which they are used.
struct Kind {
    /// Terms of the force.
    terms: [bool; 4],
    /// What else must be above zero, if anything.
    above: Option<&'static str>,
    /// What is formed first.
    defined: &'static [(&'static str, &'static str)],
    /// What is found.
    found: &'static [(Gives, Used, &'static str)],
}

const STATIC: bool = true;
const SPRING: bool = true;
const VISCOUS: bool = true;
const DRAG: bool = true;

use Gives::{Distance, NoSquare, Speed, Time};
use Used::{Always, AtRest, Through};

/// Without a spring a static force, with one it may be there or not.
static KINDS: [Kind; 13] = [
    Kind {
        terms: [STATIC, false, false, false],
        above: None,
        defined: &[],
        found: &[
            (Speed, Through, "sqrt(V0^2 - 2*p*L/M)"),
            (Time, Always, "M*(V0 - V1)/p"),
            (Time, Always, "2*L/(V0 + V1)"),
            (Distance, AtRest, "M*V0^2/(2*p)"),
        ],
    },
    Kind {
        terms: [false, false, false, DRAG],
        above: None,
        defined: &[],
        found: &[
            (Speed, Always, "V0*exp(-q*L/M)"),
            (Time, Always, "M/q*(1/V1 - 1/V0)"),
            (Time, Always, "M/(q*V0)*(exp(q*L/M) - 1)"),
        ],
    },
    Kind {
        terms: [STATIC, false, false, DRAG],
        above: Some("p/q"),
        defined: &[],
        found: &[
            (Speed, Through, "sqrt((V0^2 + p/q)*exp(-2*q*L/M) - p/q)"),
            (Distance, AtRest, "M/(2*q)*log(1 + q*V0^2/p)"),
            (Distance, AtRest, "M/(2*q)*log((p + q*V0^2)/p)"),
            (Time, Always, "M/sqrt(p*q)*(atan(V0*sqrt(q/p)) - atan(V1*sqrt(q/p)))"),
        ],
    },
    Kind {
        terms: [STATIC, false, false, DRAG],
        above: Some("p/q"),
        defined: &[("a", "sqrt(p/q)")],
        found: &[
            (Speed, Through, "sqrt((V0^2 + a^2)*exp(-2*q*L/M) - a^2)"),
            (Distance, AtRest, "M/(2*q)*log(1 + (V0/a)^2)"),
            (Time, Always, "M/(q*a)*(atan(V0/a) - atan(V1/a))"),
        ],
    },
    Kind {
        terms: [STATIC, false, false, DRAG],
        above: Some("-p/q"),
        defined: &[("a", "sqrt(-p/q)")],
        found: &[
            (Speed, Always, "sqrt((V0^2 - a^2)*exp(-2*q*L/M) + a^2)"),
            (Time, Always, "M/(2*q*a)*log((a + V1)*(a - V0)/((a - V1)*(a + V0)))"),
        ],
    },
    Kind {
        terms: [false, false, VISCOUS, false],
        above: None,
        defined: &[],
        found: &[
            (Speed, Always, "V0 - r*L/M"),
            (Time, Always, "M/r*log(V0/V1)"),
            (Time, Always, "-M/r*log(1 - r*L/(M*V0))"),
        ],
    },
    Kind {
        terms: [STATIC, false, VISCOUS, false],
        above: None,
        defined: &[("a", "p/r")],
        found: &[
            (Time, Always, "M/r*log((V0 + a)/(V1 + a))"),
            (Distance, Always, "M/r*(V0 + a)*(1 - exp(-r*T/M)) - a*T"),
            (Distance, AtRest, "M/r*(V0 - a*log(1 + V0/a))"),
            (Speed, Through, "(V0 + a)*exp(-r*T/M) - a"),
        ],
    },
    Kind {
        terms: [STATIC, SPRING, false, false],
        above: None,
        defined: &[("w", "sqrt(s/M)"), ("e", "x0 + p/s")],
        found: &[
            (Speed, Through, "sqrt(V0^2 + w^2*(e^2 - (e + L)^2))"),
            (Distance, AtRest, "sqrt(e^2 + (V0/w)^2) - e"),
            (Time, Always, "(atan(w*(e + L)/V1) - atan(w*e/V0))/w"),
            (Time, AtRest, "(pi/2 - atan(w*e/V0))/w"),
            (Distance, Always, "e*cos(w*T) + V0/w*sin(w*T) - e"),
            (Speed, Through, "V0*cos(w*T) - e*w*sin(w*T)"),
        ],
    },
    Kind {
        terms: [STATIC, SPRING, false, false],
        above: None,
        defined: &[("f", "p + s*x0")],
        found: &[
            (Speed, Through, "sqrt(V0^2 - (2*f*L + s*L^2)/M)"),
            (Distance, AtRest, "(sqrt(f^2 + s*M*V0^2) - f)/s"),
            (NoSquare, AtRest, "V0^2 - (2*f*L + s*L^2)/M"),
            (Time, Always, "sqrt(M/s)*(atan((f + s*L)/(V1*sqrt(s*M))) - atan(f/(V0*sqrt(s*M))))"),
        ],
    },
    Kind {
        terms: [STATIC, SPRING, VISCOUS, false],
        above: Some("s/M - (r/(2*M))^2"),
        defined: &[("b", "r/(2*M)"), ("u", "sqrt(s/M - b^2)"), ("e", "x0 + p/s"), ("g", "u*V0"), ("h", "b*V0 + s/M*e")],
        found: &[
            (Time, AtRest, "2*atan(g/(sqrt(g^2 + h^2) + h))/u"),
            (Distance, Always, "exp(-b*T)*(e*cos(u*T) + (V0 + b*e)/u*sin(u*T)) - e"),
            (Speed, Through, "exp(-b*T)*(V0*cos(u*T) - (b*V0 + s/M*e)/u*sin(u*T))"),
        ],
    },
    Kind {
        terms: [STATIC, SPRING, VISCOUS, false],
        above: Some("(r/(2*M))^2 - s/M"),
        defined: &[
            ("b", "r/(2*M)"),
            ("u", "sqrt(b^2 - s/M)"),
            ("e", "x0 + p/s"),
            ("k1", "-b + u"),
            ("k2", "-b - u"),
            ("c1", "(V0 - k2*e)/(k1 - k2)"),
            ("c2", "e - c1"),
        ],
        found: &[
            (Time, AtRest, "log(-c2*k2/(c1*k1))/(k1 - k2)"),
            (Distance, Always, "c1*exp(k1*T) + c2*exp(k2*T) - e"),
            (Speed, Through, "c1*k1*exp(k1*T) + c2*k2*exp(k2*T)"),
        ],
    },
    Kind {
        terms: [STATIC, SPRING, false, DRAG],
        above: None,
        defined: &[("a", "2*q/M"), ("g", "exp(-a*L)")],
        found: &[
            (Speed, Through, "sqrt(V0^2*g - (p + s*x0)/q*(1 - g) - s/q*(L - (1 - g)/a))"),
            (NoSquare, AtRest, "V0^2*g - (p + s*x0)/q*(1 - g) - s/q*(L - (1 - g)/a)"),
        ],
    },
    Kind { terms: [false; 4], above: None, defined: &[], found: &[(Time, Always, "L/V0")] },
];

/// Formulas of a kind that are read, and the condition of the kind.
struct Read {
    above: Option<Formula>,
    /// What is formed and what is found, in order.
    formulas: Vec<Formula>,
    names: Vec<&'static str>,
}

static READ: LazyLock<Vec<Read>> = LazyLock::new(|| {
    let of = |kind: &Kind| {
        let mut names = NAMES.to_vec();
        let mut formulas = Vec::new();
        for (name, text) in kind.defined {
            formulas.extend(Formula::read(text, &names));
            names.push(name);
        }
        formulas.extend(kind.found.iter().filter_map(|(.., text)| Formula::read(text, &names)));
        Read { above: kind.above.and_then(|text| Formula::read(text, &NAMES)), formulas, names }
    };
    KINDS.iter().map(of).collect()
});

/// A formula of a kind with a slip in it.
struct Slip {
    place: usize,
    formula: Formula,
}

impl Kind {
    /// Whether a passage is of this kind.
    fn holds(&self, read: &Read, passage: &Passage<'_>) -> bool {
        let mut terms = passage.terms();
        // Beside a spring, zero is a static force as well.
        terms[0] |= terms[1];
        terms == self.terms && read.above.as_ref().is_none_or(|above| above.value(&numbers(passage)) > 0.0)
    }

    /// By how much what is found of each quantity differs from what is answered, at least, relatively: `None` where nothing is found
    /// of it, or no number.
    fn off(&self, read: &Read, passage: &Passage<'_>, slip: Option<&Slip>) -> [Option<f64>; 3] {
        let mut values = numbers(passage).to_vec();
        let formula = |place: usize| match slip {
            Some(slip) if slip.place == place => &slip.formula,
            _ => &read.formulas[place],
        };
        for place in 0..self.defined.len() {
            let value = formula(place).value(&values);
            values.push(value);
        }
        let (found, from) = (passage.found, passage.from);
        let mut off: [Option<f64>; 3] = [None; 3];
        let used = |(_, used, _): &(Gives, Used, &str)| used.holds(passage.way);
        // Of several formulas for one quantity a solver has one: that with the slip.
        let slipped = slip.and_then(|slip| slip.place.checked_sub(self.defined.len()));
        let instead = slipped.filter(|index| used(&self.found[*index]));
        let instead_of = instead.map(|index| self.found[index].0.quantity(passage.way));
        for (index, of) in self.found.iter().enumerate().filter(|(_, of)| used(of)) {
            let quantity = of.0.quantity(passage.way);
            if instead != Some(index) && instead_of == Some(quantity) {
                continue;
            }
            let value = formula(self.defined.len() + index).value(&values);
            let apart = match of.0 {
                Distance => (value - found.depth) / passage.distance(),
                Time => (value - found.time) / passage.end.time,
                Speed => (value - found.velocity) / from.velocity,
                NoSquare => value / from.velocity.powi(2),
            };
            if apart.is_finite() && off[quantity].is_none_or(|least| apart.abs() < least) {
                off[quantity] = Some(apart.abs());
            }
        }
        off
    }

    /// Formulas for what that at `place` gives at other ends of the stage or in stages of other kinds, and slips in it by what is known
    /// there.
    fn slips(&self, read: &Read, place: usize) -> Vec<Slip> {
        let defined = self.defined.len();
        let known = &read.names[..NAMES.len() + place.min(defined)];
        let own = place.checked_sub(defined).map(|index| self.found[index]);
        let is_own = |name: &str| own.is_some_and(|(gives, ..)| gives.name() == name);
        let names: Vec<&str> = known.iter().copied().filter(|name| !is_own(name)).collect();
        let is_instead = |(gives, used, _): (Gives, Used, &str)| own.is_some_and(|own| own.0 == gives && own.1 != used);
        let instead = self.found.iter().zip(&read.formulas[defined..]).filter(|(found, _)| is_instead(**found));
        // What other kinds define is not known here.
        let others =
            KINDS.iter().zip(READ.iter()).filter(|(kind, _)| kind.defined.is_empty() && kind.terms != self.terms);
        let others = others.flat_map(|(kind, read)| kind.found.iter().zip(&read.formulas));
        let others = others.filter(|((gives, ..), _)| own.is_some_and(|own| own.0 == *gives));
        let instead = instead.chain(others).map(|(_, of)| of.text.clone());
        let texts = instead.chain(slips(&read.formulas[place].text, &names));
        texts.filter_map(|text| Some(Slip { place, formula: Formula::read(&text, known)? })).collect()
    }

    /// Whether `slip` explains what is wrong with `passage`; `None` where it is not used, or gives no number.
    fn explains(&self, read: &Read, slip: &Slip, passage: &Passage<'_>) -> Option<bool> {
        let found = slip.place.checked_sub(self.defined.len()).map(|index| self.found[index]);
        if found.is_some_and(|(_, used, _)| !used.holds(passage.way)) {
            return None;
        }
        let [with, without] = [Some(slip), None].map(|slip| self.off(read, passage, slip));
        // At rest there is no speed.
        if passage.way == Way::Rest && passage.wrong[2] {
            return Some(false);
        }
        let wrong = || (0..3).filter(|which| passage.wrong[*which]);
        if wrong().any(|which| without[which].is_some() && with[which].is_none()) {
            return None;
        }
        let fits = |off: Option<f64>| off.is_some_and(|off| off <= FITS);
        let fits_all = wrong().all(|which| with[which].is_none() || fits(with[which]));
        let is_explained = fits_all && wrong().any(|which| fits(with[which]) && !fits(without[which]));
        // A depth of rest beyond the end of the stage is none: what is answered then is something else.
        let is_at_limit = passage.found.depth >= passage.alone.exit_depth * (1.0 - FITS);
        let is_beyond = passage.way == Way::Rest && is_at_limit && found.is_some_and(|(gives, ..)| gives == Distance);
        if !is_explained && is_beyond { None } else { Some(is_explained) }
    }

    /// Whether a right passage would be another with `slip`.
    fn is_contradicted(&self, read: &Read, slip: &Slip, passage: &Passage<'_>) -> bool {
        let [with, without] = [Some(slip), None].map(|slip| self.off(read, passage, slip));
        (0..3).any(|which| {
            without[which].is_some_and(|off| off <= CONTRADICTS) && with[which].is_none_or(|off| off > CONTRADICTS)
        })
    }

    /// How the passages of `wrong` end that `slip` explains, and how many it says nothing of, if those are enough, and hardly one of `right`
    /// that ends alike contradicts.
    fn explained_by(
        &self,
        read: &Read,
        slip: &Slip,
        wrong: &[&Passage<'_>],
        right: &[&Passage<'_>],
    ) -> Option<(Vec<Way>, usize)> {
        let part = if wrong.iter().any(|passage| passage.is_supposed) { MOST_OF_SUPPOSED } else { MOST };
        let may_leave = wrong.len() - (part * wrong.len() as f64).ceil() as usize;
        let (mut ways, mut left, mut silent) = (Vec::new(), 0, 0);
        for passage in wrong {
            match self.explains(read, slip, passage) {
                Some(true) => ways.push(passage.way),
                Some(false) => left += 1,
                None => silent += 1,
            }
            if left > may_leave {
                return None;
            }
        }
        let contradicts =
            |passage: &&&Passage<'_>| ways.contains(&passage.way) && self.is_contradicted(read, slip, passage);
        // For short ways a solver may have a series.
        let is_right = ways.len() >= FAR_MORE_THAN_RIGHT * right.iter().filter(contradicts).count();
        (ways.len() >= ENOUGH && is_right).then_some((ways, silent))
    }

    /// What `slip` changes, of passages that end by `ways`.
    fn said(&self, read: &Read, slip: &Slip, ways: &[Way]) -> String {
        let name = match self.found.get(slip.place.wrapping_sub(self.defined.len())) {
            Some((gives, ..)) => gives.name(),
            None => read.names[NAMES.len() + slip.place],
        };
        let is_all = |way: Way| ways.iter().all(|one| *one == way);
        let end = match () {
            () if is_all(Way::Rest) => " to rest",
            () if is_all(Way::Exit) => " to the exit",
            () if is_all(Way::Through) => " to its end",
            () => "",
        };
        let terms: Vec<&str> = TERMS.into_iter().zip(self.terms).filter(|(_, has)| *has).map(|(of, _)| of).collect();
        let terms = if terms.is_empty() { "no force".to_owned() } else { format!("{} alone", terms.join(" and ")) };
        let defined: Vec<String> = self.defined.iter().map(|(name, text)| format!("{name} = {text}")).collect();
        let defined = if defined.is_empty() { String::new() } else { format!(" ({})", defined.join(", ")) };
        format!(
            "in a stage of {terms}, from V0 at the depth x0 over a distance L and a time T to V1{defined}, {name}{end} is formed as {}, \
             not as {}",
            slip.formula.text, read.formulas[slip.place].text
        )
    }
}

/// What a slip explains.
pub(super) struct Explained {
    pub statement: String,
    /// Wrong passages that it explains.
    pub count: usize,
    /// All of which it says something; of those that are supposed to be wrong, those of its kind.
    pub of: usize,
}

/// The slip in a closed form that explains most of `wrong`, and that none of `right` contradicts.
pub(super) fn explained(wrong: &[&Passage<'_>], right: &[&Passage<'_>]) -> Option<Explained> {
    let mut best: Option<Explained> = None;
    for (kind, read) in KINDS.iter().zip(READ.iter()) {
        let of_wrong: Vec<&Passage<'_>> = wrong.iter().copied().filter(|passage| kind.holds(read, passage)).collect();
        // One of several in a flight may be right.
        let is_alone = |passage: &&&Passage<'_>| {
            let same = of_wrong.iter().filter(|other| std::ptr::eq(other.question, passage.question));
            !passage.is_supposed || same.count() == 1
        };
        let of_wrong: Vec<&Passage<'_>> = of_wrong.iter().filter(is_alone).copied().collect();
        let of_right: Vec<&Passage<'_>> = right.iter().copied().filter(|passage| kind.holds(read, passage)).collect();
        if of_wrong.len() < ENOUGH {
            continue;
        }
        for slip in (0..read.formulas.len()).flat_map(|place| kind.slips(read, place)) {
            if let Some((ways, silent)) = kind.explained_by(read, &slip, &of_wrong, &of_right)
                && best.as_ref().is_none_or(|best| ways.len() > best.count)
            {
                let is_supposed = of_wrong.iter().all(|passage| passage.is_supposed);
                let of = if is_supposed { of_wrong.len() } else { wrong.len() - silent };
                best = Some(Explained { statement: kind.said(read, &slip, &ways), count: ways.len(), of });
            }
        }
    }
    best
}

/// Values of [`NAMES`] in a passage, as the solver answers it.
fn numbers(passage: &Passage<'_>) -> [f64; NAMES.len()] {
    let Stage { static_force, stiffness, viscosity, drag, .. } = passage.law;
    let (from, found) = (passage.from, passage.found);
    [
        passage.mass,
        static_force,
        stiffness,
        viscosity,
        drag,
        from.depth,
        from.velocity,
        found.depth,
        found.time,
        found.velocity,
    ]
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::super::super::super::questions::{Content, Question, questions};
    use super::super::{RIGHT_AND_WRONG, judged};
    use super::*;
    use crate::integrators::{Detail, Integrator, Taylor};
    use crate::physics::State;

    /// The right passages of `questions`.
    fn right_passages(questions: &[Question]) -> Vec<Passage<'_>> {
        let mut all = Vec::new();
        for question in questions.iter().filter(|question| question.problem.impact_speed > 0.0) {
            let problem = &question.problem;
            let Ok(flight) = Taylor::default().solve(problem, Detail::Events) else { continue };
            let mut from = State::at_impact(problem);
            for (index, law) in problem.stages.iter().enumerate().take(flight.stage + 1) {
                let to = if index < flight.stage { flight.events[index].state } else { flight.end };
                all.extend(judged(question, index, [from, to], law.end.min(problem.exit_depth), RIGHT_AND_WRONG[0]));
                from = to;
            }
        }
        all
    }

    /// `passage` as a solver answers it that has a formula with `slip`; `None` where that does not show.
    fn slipped<'a>(kind: &Kind, read: &Read, slip: &Slip, passage: &Passage<'a>) -> Option<Passage<'a>> {
        let (gives, used, _) = kind.found[slip.place - kind.defined.len()];
        if !kind.holds(read, passage) || !used.holds(passage.way) {
            return None;
        }
        let mut values = numbers(passage).to_vec();
        for defined in &read.formulas[..kind.defined.len()] {
            values.push(defined.value(&values));
        }
        let value = slip.formula.value(&values);
        let mut found = passage.found;
        match gives {
            Distance if passage.way == Way::Rest => found.depth = value,
            Time => found.time = value,
            Speed => found.velocity = value,
            _ => return None,
        }
        let to = State { time: passage.from.time + found.time, depth: passage.from.depth + found.depth, ..found };
        let limit = passage.law.end.min(passage.question.problem.exit_depth);
        let judged = judged(passage.question, passage.index, [passage.from, to], limit, RIGHT_AND_WRONG[0])?;
        (to.is_finite() && judged.is_wrong()).then_some(judged)
    }

    #[test]
    fn formulas_as_they_should_be_fit_right_passages() {
        let questions = questions(11, 400, false);
        let passages = right_passages(&questions);
        for (number, (kind, read)) in KINDS.iter().zip(READ.iter()).enumerate() {
            assert_eq!(read.formulas.len(), kind.defined.len() + kind.found.len(), "kind {number}");
            let mut seen = vec![0; kind.found.len()];
            // Beside a strong term a weak one cancels all digits of a closed form.
            let is_weak = |passage: &&Passage<'_>| passage.question.contains.contains(&Content::WeakTerm);
            let of_kind = passages.iter().filter(|passage| kind.holds(read, passage));
            for passage in of_kind.filter(|passage| !is_weak(passage)) {
                assert!(!passage.is_wrong());
                for (index, count) in seen.iter_mut().enumerate() {
                    let (gives, used, text) = kind.found[index];
                    if !used.holds(passage.way) {
                        continue;
                    }
                    // With itself in its own place it stands alone.
                    let place = kind.defined.len() + index;
                    let formula = Formula::read(&read.formulas[place].text, &read.names).unwrap();
                    let off = kind.off(read, passage, Some(&Slip { place, formula }))[gives.quantity(passage.way)];
                    let Some(off) = off else { continue };
                    assert!(off <= FITS, "{gives:?} as {text} of {}: {off:e} {:?}", passage.question.id, passage.law);
                    *count += 1;
                }
            }
            assert!(seen.iter().all(|count| *count >= ENOUGH), "kind {number}: {seen:?} of {:?}", kind.found);
        }
    }

    #[test]
    fn a_slip_in_a_closed_form_is_told_by_the_ends_that_it_gives() {
        let questions = questions(12, 400, false);
        let passages = right_passages(&questions);
        let (mut untold, mut of) = (Vec::new(), 0);
        for (kind, read) in KINDS.iter().zip(READ.iter()) {
            for place in kind.defined.len()..read.formulas.len() {
                let all = kind.slips(read, place);
                for slip in all.iter().step_by(all.len() / 4) {
                    let wrong: Vec<Passage<'_>> =
                        passages.iter().filter_map(|passage| slipped(kind, read, slip, passage)).collect();
                    if wrong.len() < ENOUGH {
                        continue;
                    }
                    of += 1;
                    let right: Vec<&Passage<'_>> =
                        passages.iter().filter(|passage| !kind.holds(read, passage)).collect();
                    let found = explained(&wrong.iter().collect::<Vec<_>>(), &right);
                    if found.as_ref().is_none_or(|found| found.count < wrong.len()) {
                        let found = found.map(|found| (found.count, found.statement));
                        untold.push(format!("{}: {found:?} of {}", slip.formula.text, wrong.len()));
                    }
                }
            }
        }
        assert!(of > 60 && untold.is_empty(), "{} of {of}:\n{}", untold.len(), untold.join("\n"));
    }

    /// A slip in the time of a kind of stage, and the passages that it makes wrong.
    fn with_a_slip_in_the_time<'a>(passages: &[Passage<'a>], kind: &Kind, read: &Read) -> Vec<Passage<'a>> {
        let index = kind.found.iter().position(|(gives, ..)| *gives == Time).unwrap();
        let place = kind.defined.len() + index;
        let text = format!("1.3*({})", read.formulas[place].text.replace("V0", "(V0/2)"));
        let slip = Slip { place, formula: Formula::read(&text, &read.names).unwrap() };
        let two = Slip { place, formula: Formula::read(&text[4..], &read.names).unwrap() };
        // One in four by a mistake that no slip is.
        let wrong = passages.iter().filter(|passage| passage.way != Way::Rest);
        wrong
            .enumerate()
            .filter_map(|(n, passage)| slipped(kind, read, if n % 4 == 0 { &slip } else { &two }, passage))
            .collect()
    }

    #[test]
    fn a_slip_that_a_right_stage_contradicts_is_no_cause() {
        let questions = questions(12, 400, false);
        let passages = right_passages(&questions);
        let right: Vec<&Passage<'_>> = passages.iter().collect();
        let mut told = 0;
        for (kind, read) in KINDS.iter().zip(READ.iter()).take(4) {
            let wrong = with_a_slip_in_the_time(&passages, kind, read);
            let wrong: Vec<&Passage<'_>> = wrong.iter().collect();
            told += usize::from(explained(&wrong, &[]).is_some());
            let found = explained(&wrong, &right).map(|found| found.statement);
            assert!(found.is_none(), "{found:?}");
        }
        assert!(told > 0);
    }

    #[test]
    fn a_slip_must_explain_nearly_all_stages_that_are_only_supposed_to_be_wrong() {
        let questions = questions(12, 400, false);
        let passages = right_passages(&questions);
        let mut told = 0;
        for (kind, read) in KINDS.iter().zip(READ.iter()).take(4) {
            let mut wrong = with_a_slip_in_the_time(&passages, kind, read);
            told += usize::from(explained(&wrong.iter().collect::<Vec<_>>(), &[]).is_some());
            for passage in &mut wrong {
                passage.is_supposed = true;
            }
            let found = explained(&wrong.iter().collect::<Vec<_>>(), &[]).map(|found| found.statement);
            assert!(found.is_none(), "{found:?}");
        }
        assert!(told > 0);
    }
}
