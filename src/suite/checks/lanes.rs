//! Tables of scenes, solved in lanes and row by row: from the text of a table to the text of its results.

use std::f64::consts::FRAC_PI_4;

use super::super::claim::{Found, NotMeasured};
use super::edges::{exact, exact_margin, is_right};
use super::{Subject, Worst, off, solve, worse};
use crate::exchange::tables::{Block, CsvTable, TableWriter};
use crate::integrators::lanes::{Batch, Summary};
use crate::integrators::{Accuracy, Detail, Method};
use crate::physics::{Concrete, CraterStiffness, Criterion, Outcome, Problem, Resistance, Scene, Stage, State};
use crate::studies::batch::{Answer, RESULT_COLUMNS, RowError, SCENES, Scenes, Tally, answers};
use crate::studies::error::{Errors, conditions_in_dual_numbers};
use crate::studies::random::Random;

check! {
    /// A table of `rows` random scenes of every kind, written as text, solved by the method as `batch` does, and its
    /// results read from their text: worst error of a number against double-double (V_c: against its formula) over max(1,
    /// condition number). Stages other than those of the formulas, a row that depends on its neighbours, a wrong
    /// outcome, and a cell that is not the number it names break it.
    TableOfScenes {
        /// How many, besides one that is bad.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        rows: usize,
    } in Random, "promises x condition", by table_of_scenes, compares (Lanes | FiftyDigits);
    /// Error bounds of `rows` margins computed in lanes against those of the Taylor series alone: the worst quotient of
    /// the larger and the smaller.
    BoundsOfLanes {
        /// How many.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        rows: usize,
    } in Random, "quotient", by bounds_of_lanes, compares nothing;
}

/// Names of the columns, as a person writes them.
const NAMES: [&str; 12] = [
    "mass_kg",
    "diameter_m",
    "nose_factor",
    "strength_pa",
    "density_kg_m3",
    "thickness_m",
    "S",
    "B",
    "k",
    "crater_stiffness_n_m",
    "velocity_m_s",
    "criterion",
];

/// What a row aims at, in turn; their number has no divisor in common with that of the lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Aim {
    CraterStop,
    TunnelStop,
    Perforation,
    StopBeforeExit,
    AtCraterEnd,
    ThinnerThanCrater,
    Grazing,
    NoFarSide,
    NoCrater,
    GivenStiffness,
    NoDrag,
    WeakDrag,
    StrongDrag,
}

impl Aim {
    const ALL: [Self; 13] = [
        Self::CraterStop,
        Self::TunnelStop,
        Self::Perforation,
        Self::StopBeforeExit,
        Self::AtCraterEnd,
        Self::ThinnerThanCrater,
        Self::Grazing,
        Self::NoFarSide,
        Self::NoCrater,
        Self::GivenStiffness,
        Self::NoDrag,
        Self::WeakDrag,
        Self::StrongDrag,
    ];
}

/// A row of the table: its cells, `None` for an empty one, and what they mean.
#[derive(Clone, Debug)]
struct Row {
    /// The first eleven, in the order of [`NAMES`].
    cells: [Option<f64>; 11],
    criterion: &'static str,
    /// Static factor, inertia factor and crater ratio that hold, given or not.
    factors: [f64; 3],
}

impl Row {
    fn number(&self, index: usize) -> f64 {
        self.cells[index].unwrap_or(f64::NAN)
    }

    /// P and Q of the tunnel, and the crater depth k d, by their definitions.
    fn law(&self) -> [f64; 3] {
        let [_, d, nose, strength, density] = [0, 1, 2, 3, 4].map(|index| self.number(index));
        let [s, b, k] = self.factors;
        let area = FRAC_PI_4 * d * d;
        [area * s * strength, area * nose * b * density, k * d]
    }

    /// Constant c of the crater at impact speed `v0`.
    fn stiffness(&self, v0: f64) -> f64 {
        let ([p, q, depth], mass) = (self.law(), self.number(0));
        self.cells[9].unwrap_or(mass * (p + q * v0 * v0) / (depth * (mass + depth * q)))
    }

    /// Critical velocity (m/s) by energy, and its condition number, for a far side at H.
    fn critical(&self) -> Option<(f64, f64)> {
        let ([p, q, depth], mass, thickness) = (self.law(), self.number(0), self.cells[5]?);
        let beyond = (thickness - depth).max(0.0);
        let y = 2.0 * q * beyond / mass;
        let squared = match self.cells[9].filter(|_| depth > 0.0) {
            Some(given) if thickness <= depth => given * thickness * thickness / mass,
            None if thickness <= depth => {
                let share = thickness * thickness;
                p * share / (depth * (mass + depth * q) - q * share)
            }
            given => {
                let v1 = 2.0 * p * beyond / mass * if y == 0.0 { 1.0 } else { y.exp_m1() / y };
                given.map_or(v1 * (1.0 + depth * q / mass) + depth * p / mass, |c| v1 + c * depth * depth / mass)
            }
        };
        Some((squared.sqrt(), 2.0 + y))
    }

    /// The scene that the row describes.
    fn scene(&self) -> Scene {
        let [mass, diameter, nose_factor, strength, density] = [0, 1, 2, 3, 4].map(|index| self.number(index));
        let [static_factor, inertia_factor, crater_ratio] = self.factors;
        let concrete = Concrete {
            diameter,
            nose_factor,
            strength,
            density,
            static_factor,
            follows_eq14: self.cells[6].is_none(),
            inertia_factor,
            crater_ratio,
            crater_stiffness: self.cells[9].map_or(CraterStiffness::Continuous, CraterStiffness::Given),
            layers: Vec::new(),
        };
        Scene {
            title: None,
            mass,
            forces: Vec::new(),
            ends: Vec::new(),
            plug: None,
            parameters: Vec::new(),
            resistance: Resistance::Concrete(concrete),
            thickness: self.cells[5],
            criterion: if self.criterion == "ndrc" { Criterion::Ndrc } else { Criterion::FullDepth },
            velocity: self.cells[10],
        }
    }

    /// One aimed at `aim`.
    fn draw(aim: Aim, random: &mut Random) -> Self {
        let mass = random.log_uniform(0.05, 50.0);
        let diameter = random.log_uniform(0.01, 0.2);
        let nose = random.log_uniform(0.05, 1.0);
        let strength = random.log_uniform(20e6, 120e6);
        let given_s = random.chance(0.6).then(|| random.log_uniform(4.0, 25.0));
        let given_b = random.chance(0.5).then(|| random.log_uniform(0.5, 2.0));
        let given_k = match aim {
            Aim::NoCrater => Some(0.0),
            _ => random.chance(0.6).then(|| random.log_uniform(0.3, 5.0)),
        };
        let geometry = match aim {
            Aim::NoDrag => f64::INFINITY,
            Aim::WeakDrag => random.log_uniform(1e5, 1e9),
            Aim::StrongDrag => random.log_uniform(0.5, 3.0),
            _ => random.log_uniform(10.0, 1e4),
        };
        // Eq. 14; B = 1 and k = 2 where nothing is said.
        let factors =
            [given_s.unwrap_or(72.0 / (strength / 1e6).sqrt()), given_b.unwrap_or(1.0), given_k.unwrap_or(2.0)];
        let density = mass / (nose * factors[1] * diameter * diameter * diameter * geometry);
        let mut row = Self {
            cells: [
                Some(mass),
                Some(diameter),
                Some(nose),
                Some(strength),
                Some(density),
                None,
                given_s,
                given_b,
                given_k,
                None,
                None,
            ],
            criterion: if random.chance(0.3) { "full-depth" } else { "" },
            factors,
        };
        let [p, _, depth] = row.law();
        // Its square: the energy that the crater takes at its end, without drag.
        let to_crater_end = (p * depth / mass).sqrt();
        let scale = diameter * random.log_uniform(0.5, 10.0);
        let thickness = match aim {
            Aim::NoFarSide => None,
            Aim::CraterStop | Aim::TunnelStop => random.chance(0.4).then_some(20.0 * diameter),
            Aim::AtCraterEnd => Some(factors[2] * diameter),
            Aim::ThinnerThanCrater => Some(depth * random.uniform(0.05, 0.95)),
            // Drag multiplies the energy to perforate by e for every N/pi diameters.
            Aim::StrongDrag => Some(depth + 0.2 * scale),
            _ => Some(if random.chance(0.7) { depth + scale } else { scale }),
        };
        if aim == Aim::GivenStiffness {
            row.cells[9] = Some(p / depth * random.log_uniform(0.25, 4.0));
        }
        row.cells[5] = thickness;
        let critical = row.critical().map_or(f64::NAN, |(velocity, _)| velocity);
        let either = [random.uniform(0.3, 0.95), random.log_uniform(1.05, 5.0)][usize::from(random.chance(0.5))];
        row.cells[10] = Some(match aim {
            Aim::CraterStop => to_crater_end * random.uniform(0.05, 0.95),
            Aim::TunnelStop | Aim::NoFarSide => to_crater_end * random.log_uniform(1.05, 6.0),
            Aim::Perforation => critical * random.log_uniform(1.01, 5.0),
            Aim::StopBeforeExit => critical * random.uniform(0.3, 0.99),
            Aim::Grazing => {
                let nearness = 10f64.powf(-random.uniform(6.0, 16.0));
                critical * (1.0 + nearness * [-1.0, 1.0][random.below(2)])
            }
            _ => critical * either,
        });
        if matches!(aim, Aim::Perforation | Aim::StopBeforeExit) && random.chance(0.3) {
            row.criterion = "ndrc";
        }
        row
    }

    /// Its line of a table whose columns stand in `order`.
    fn line(&self, order: &[usize]) -> String {
        let cell = |&index: &usize| match index {
            11 => self.criterion.to_owned(),
            _ => self.cells[index].map(|value| value.to_string()).unwrap_or_default(),
        };
        order.iter().map(cell).collect::<Vec<_>>().join(",")
    }

    /// What is wrong with `problem`, whose numbers follow from the row by the definitions of docs/theory.md, section 1.
    fn fault(&self, problem: &Problem) -> Option<String> {
        let [p, q, depth] = self.law();
        let v0 = self.number(10);
        let tunnel = Stage::tunnel(p, q);
        let crater = (depth > 0.0).then(|| Stage::crater(self.stiffness(v0), depth));
        let expected: Vec<Stage> = crater.into_iter().chain([tunnel]).collect();
        let is_near = |value: f64, expected: f64| value == expected || off(value, expected) <= 8.0 * f64::EPSILON;
        let exit = match (self.cells[5], problem.exit_depth / self.number(1)) {
            (None, ratio) => ratio == f64::INFINITY,
            // The ACE/NDRC relation as printed: one of its two branches gives H/d of the exit depth.
            (Some(h), x) if self.criterion == "ndrc" => {
                let h = h / self.number(1);
                off((3.19 - 0.718 * x) * x, h).min(off(1.32 + 1.24 * x, h)) <= 1e-13
            }
            (Some(h), _) => problem.exit_depth == h,
        };
        let numbers = |stage: &Stage| [stage.static_force, stage.stiffness, stage.viscosity, stage.drag, stage.end];
        let is_right = exit
            && problem.mass == self.number(0)
            && problem.impact_speed == v0
            && problem.stages.len() == expected.len()
            && problem.crater == crater.map(|_| 0)
            && problem.stages.iter().zip(&expected).all(|(stage, expected)| {
                numbers(stage).iter().zip(numbers(expected)).all(|(&value, expected)| is_near(value, expected))
            });
        (!is_right).then(|| format!("{problem:?}, and the row means {expected:?}"))
    }
}

/// `rows` rows of every kind in turn, from the seed of the run.
fn rows(subject: &Subject<'_>, rows: usize) -> Vec<Row> {
    let mut random = subject.random("table of scenes");
    (0..rows).map(|index| Row::draw(Aim::ALL[index % Aim::ALL.len()], &mut random)).collect()
}

/// The scenes of a table of `lines` below the names of its columns in `order`.
fn read(order: &[usize], lines: &[String]) -> Found<Scenes> {
    let names: Vec<_> = order.iter().map(|&index| NAMES[index]).collect();
    let text = format!("{}\n{}\n", names.join(","), lines.join("\n"));
    let mut table = CsvTable::new("table.csv", text.as_bytes(), &SCENES)?;
    Ok(Scenes::Table(table.next_rows(lines.len() + 1, None)?))
}

/// The cells of the results of `scenes`, as their text has them; the first row is number `first`.
fn written(scenes: &Scenes, first: u64, found: &[Result<Answer, RowError>]) -> Found<Vec<Vec<String>>> {
    let block: Block = scenes.results(0, first, found, &RESULT_COLUMNS, false);
    let mut table = TableWriter::new(Vec::new(), &RESULT_COLUMNS, false)?;
    table.push(block)?;
    let text = String::from_utf8(table.finish()?)?;
    let mut lines = text.lines();
    let names = "row,outcome,depth_m,time_s,velocity_m_s,crater_end_time_s,crater_end_velocity_m_s,exit_margin,\
                 critical_velocity_m_s,X_over_d_eq11_12,error";
    holds!(lines.next() == Some(names), "the results have other columns: {text:.120}");
    Ok(lines.map(|line| line.splitn(11, ',').map(str::to_owned).collect()).collect())
}

/// The cell of a number: empty where there is none.
fn parsed(cell: &str) -> Found<Option<f64>> {
    if cell.is_empty() { Ok(None) } else { Ok(Some(cell.parse()?)) }
}

fn table_of_scenes(&TableOfScenes { rows: count }: &TableOfScenes, subject: &Subject<'_>) -> Found {
    let (method, made) = (subject.method(None)?, rows(subject, count));
    let mut random = subject.random("columns");
    let mut order: Vec<usize> = (0..NAMES.len()).collect();
    for index in 1..order.len() {
        order.swap(index, random.below(index + 1));
    }
    let mut lines: Vec<String> = made.iter().map(|row| row.line(&order)).collect();
    // A bad row among them is an error of its own and moves no other.
    let bad = count / 2;
    let mut spoilt = made[bad].clone();
    spoilt.cells[3] = Some(-36e6);
    lines.insert(bad, spoilt.line(&order));

    let scenes = read(&order, &lines)?;
    let all = || scenes.scenes(0..lines.len());
    let found = answers(all(), &method, true);
    let cells = written(&scenes, 7, &found)?;
    holds!(cells.len() == lines.len(), "{} results of {} rows", cells.len(), lines.len());
    let said = &cells[bad];
    let tells = said[10].contains(&format!("line {}", bad + 2)) && said[1..10].iter().all(String::is_empty);
    holds!(tells && all()[bad].is_err() | found[bad].is_err(), "of the bad row is said {said:?}");

    let mut worst = Worst::default();
    let (mut undecided, mut outside_eq14) = (0, 0);
    let mut reached = std::collections::BTreeMap::<&str, usize>::new();
    for (index, scene) in all().into_iter().enumerate().filter(|(index, _)| *index != bad) {
        let row = &made[index - usize::from(index > bad)];
        let name = || format!("in row {index}, {:?}", row.cells);
        let scene = scene?;
        let mut expected = row.scene();
        if let (true, Resistance::Concrete(c)) = (row.cells[6].is_none(), &mut expected.resistance) {
            c.static_factor = scene.concrete().map_or(f64::NAN, |concrete| concrete.static_factor);
        }
        holds!(scene == expected, "row {index} is read as {scene:?}");
        let problem = scene.problem()?;
        if let Some(fault) = row.fault(&problem) {
            return Err(NotMeasured::broken(format!("row {index}: {fault}")));
        }
        let answer = found[index].as_ref().map_err(|error| NotMeasured::broken(format!("row {index}: {error}")))?;
        let row_cells = &cells[index];
        holds!(row_cells[0] == (index + 7).to_string(), "row {index} has the number {}", row_cells[0]);
        let values = row_cells[2..10].iter().map(|cell| parsed(cell)).collect::<Found<Vec<_>>>()?;
        let solution = of_cells(&row_cells[1], &values, &answer.solution)
            .ok_or_else(|| NotMeasured::broken(format!("row {index}: the cells {row_cells:?} of {answer:?}")))?;
        worst.take(error_of(subject, &problem, &solution)?, name);
        let critical = answer.critical.as_ref().map(|found| found.as_ref().map_err(ToString::to_string));
        match (row.critical(), values[6], critical) {
            (Some((exact, condition)), Some(value), Some(Ok(same))) if row.criterion != "ndrc" => {
                holds!(value == *same, "row {index}: V_c {value} is printed, {same} found");
                worst.take(off(value, exact) / condition / subject.promise(), name);
            }
            (None, None, None) | (Some(_), Some(_), Some(Ok(_))) => {}
            (_, printed, other) => {
                return Err(NotMeasured::broken(format!("row {index}: V_c is {printed:?}, from {other:?}")));
            }
        }
        let by_eq11_12 = depth_of_eq11_12(&scene).unwrap_or(f64::NAN);
        holds!(
            off(values[7].unwrap_or(f64::NAN), by_eq11_12) < 1e-14,
            "row {index}: X/d {:?} of {by_eq11_12}",
            values[7]
        );
        undecided += u64::from(solution.outcome == Outcome::Undecided);
        let [strength, d, speed] = [3, 1, 10].map(|cell| row.cells[cell].unwrap_or(f64::NAN));
        let is_outside = !(13.5e6..=96.7e6).contains(&strength) || d >= 0.076 || speed >= 1200.0;
        outside_eq14 += u64::from(row.cells[6].is_none() && is_outside);
        *reached.entry(solution.outcome.name()).or_default() += 1;
    }
    let tally = Tally { rows: lines.len() as u64, bad: 1, undecided, unstable: 0, outside_eq14 };
    holds!(Tally::of(&found) == tally, "{:?} in place of {tally:?}", Tally::of(&found));
    for outcome in ["stopped-in-crater", "stopped-in-tunnel", "perforated"] {
        let count = reached.get(outcome).copied().unwrap_or_default();
        holds!(count * 12 >= made.len(), "only {count} of {} rows are {outcome}", made.len());
    }
    neighbours(subject, &method, &lines, &order, &found)?;
    let found = worst.measurement();
    let remark = format!("{}; {reached:?}", found.remark);
    Ok(found.resolving(1.0).remark(remark))
}

/// X/d of Eq. 11-12 for `scene`, as it is printed.
fn depth_of_eq11_12(scene: &Scene) -> Option<f64> {
    let (c, speed) = (scene.concrete()?, scene.velocity?);
    let impact = scene.mass * speed.powi(2) / (c.static_factor * c.strength * c.diameter.powi(3));
    let (k, pi) = (c.crater_ratio, std::f64::consts::PI);
    Some(if impact <= k * pi / 4.0 { (4.0 * k * impact / pi).sqrt() } else { k / 2.0 + 2.0 * impact / pi })
}

/// The solution that the cells of a row state, if they are those of `solution`.
fn of_cells(outcome: &str, values: &[Option<f64>], solution: &Summary) -> Option<Summary> {
    let [Some(depth), Some(time), Some(velocity), crater_time, crater_velocity, exit_margin, ..] = *values else {
        return None;
    };
    let crater_end = crater_time.zip(crater_velocity).zip(solution.crater_end);
    let read = Summary {
        end: State { time, depth, velocity },
        crater_end: crater_end.map(|((time, velocity), state)| State { time, velocity, ..state }),
        exit_margin,
        ..*solution
    };
    let is_whole = crater_time.is_some() == crater_velocity.is_some();
    (is_whole && outcome == solution.outcome.name() && read == *solution).then_some(read)
}

/// Worst error of `solution` against double-double in promises of the method over max(1, condition number); a margin
/// beyond its error bound and a wrong outcome break the claim.
fn error_of(subject: &Subject<'_>, problem: &Problem, solution: &Summary) -> Found<f64> {
    let exact = exact(problem)?;
    if problem.has_exit() {
        let margin = exact_margin(problem)?;
        holds!(is_right(solution.outcome, margin), "{} at a margin of {margin:e}", solution.outcome);
        let (found, bound) = (solution.exit_margin, solution.exit_margin_error);
        let (found, bound) = found.zip(bound).ok_or_else(|| NotMeasured::broken("no margin"))?;
        let rounding = 16.0 * f64::EPSILON * margin.abs();
        holds!((found - margin).abs() <= bound + rounding, "margin {found:e} ± {bound:e} of {margin:e}");
    }
    // Within a rounding of V_c double-double itself, which states an error bound of f64, may not say what is right.
    if [solution.outcome, exact.outcome].contains(&Outcome::Undecided) {
        return Ok(0.0);
    }
    holds!(solution.outcome.agrees_with(exact.outcome), "{} where {} is right", solution.outcome, exact.outcome);
    let errors = Errors::in_double_double(&solution.flight(), &exact, problem.impact_speed);
    let conditions = conditions_in_dual_numbers(problem)?;
    let (units, _) = errors.over(&conditions).worst().unwrap_or((f64::NAN, crate::studies::Quantity::Depth));
    Ok(units * f64::EPSILON / subject.promise())
}

/// A row is answered by the same bits in every table that holds it: in each remainder of the lanes, from every place,
/// backwards, and beside a whole block of others; and as by the method alone where it works row by row.
fn neighbours(
    subject: &Subject<'_>,
    method: &Method,
    lines: &[String],
    order: &[usize],
    whole: &[Result<Answer, RowError>],
) -> Found<()> {
    let plain = |answer: &Result<Answer, RowError>| answer.as_ref().ok().map(|answer| key(&answer.solution));
    let in_lanes = subject.method_name().accuracy() == Accuracy::RoundOff;
    let mut from = 0;
    for size in (1..=17).chain([23, 31, 33, 47, 63]) {
        let part: Vec<usize> = (from..from + size).map(|index| index % lines.len()).collect();
        from += size;
        for backwards in [false, true] {
            let part: Vec<usize> = if backwards { part.iter().rev().copied().collect() } else { part.clone() };
            let text: Vec<String> = part.iter().map(|&index| lines[index].clone()).collect();
            let scenes = read(order, &text)?;
            let found = answers(scenes.scenes(0..size), method, false);
            holds!(found.len() == size, "{} answers to {size} rows", found.len());
            for (&index, answer) in part.iter().zip(&found) {
                holds!(plain(answer) == plain(&whole[index]), "row {index} is another in a table of {size}");
            }
        }
        if !in_lanes && size > 8 {
            break;
        }
    }
    let problems =
        read(order, lines)?.scenes(0..lines.len()).into_iter().filter_map(|scene| scene.ok()?.problem().ok());
    let kept = whole.iter().filter_map(|answer| answer.as_ref().ok());
    for (problem, answer) in problems.zip(kept) {
        let alone = Summary::from(&solve(method, &problem, Detail::Events)?);
        let found = &answer.solution;
        // Lanes promise the same stage, outcome and crater end; other methods are the method itself.
        let is_same = if subject.method_name().accuracy() == Accuracy::RoundOff {
            let ends = [alone.crater_end, found.crater_end].map(|state| state.map(|state| state.depth));
            (alone.outcome, alone.stage, ends[0]) == (found.outcome, found.stage, ends[1])
        } else {
            key(&alone) == key(found)
        };
        holds!(is_same, "{found:?} in a table, {alone:?} alone");
    }
    Ok(())
}

/// A solution but for its cost, which a solver that is used again does not pay twice.
fn key(solution: &Summary) -> Summary {
    Summary { cost: crate::integrators::Cost::default(), ..*solution }
}

fn bounds_of_lanes(&BoundsOfLanes { rows: count }: &BoundsOfLanes, subject: &Subject<'_>) -> Found {
    let problems = rows(subject, count).iter().map(|row| row.scene().problem()).collect::<Result<Vec<_>, _>>()?;
    let method = subject.method(None)?;
    let mut worst = Worst::default();
    let mut judged = 0;
    for (problem, found) in problems.iter().zip(Batch::new().solve(&problems)) {
        let (found, alone) = (found?, solve(&method, problem, Detail::End)?);
        let Some((bound, expected)) = found.exit_margin_error.zip(alone.exit_margin_error) else { continue };
        judged += 1;
        worst.take(worse(bound / expected, expected / bound), || format!("{bound:e} of {problem:?}"));
    }
    holds!(judged * 2 > count, "only {judged} of {count} rows have a margin");
    Ok(worst.measurement())
}
