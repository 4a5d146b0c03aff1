//! Known schemes of several steps, and which number of one, changed alone, gives the steps that came.
//!
//! Source: Hairer, Nørsett, Wanner (1993), Solving Ordinary Differential Equations I, section III.1.

/// `V(n+1) = sum a_i V(n-i) + h (b V*' + sum b_i V'(n-i))`, where `V*` is `V(n+1)`, or `V(n) + h sum p_i V'(n-i)` if there is a
/// predictor.
struct Multistep {
    name: &'static str,
    /// a_i, the newest first.
    values: &'static [f64],
    /// b.
    new_slope: f64,
    /// b_i.
    slopes: &'static [f64],
    /// p_i.
    predictor: &'static [f64],
}

/// The weights of Adams and Bashforth's schemes of order 1 to 4.
pub(super) const BASHFORTH: [&[f64]; 4] = [
    &[1.0],
    &[3.0 / 2.0, -1.0 / 2.0],
    &[23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
    &[55.0 / 24.0, -59.0 / 24.0, 37.0 / 24.0, -9.0 / 24.0],
];
/// The weights of Adams and Moulton's schemes of order 2, 3 and 4: that of the new slope, and of the others.
const MOULTON: [(f64, &[f64]); 3] = [
    (1.0 / 2.0, &[1.0 / 2.0]),
    (5.0 / 12.0, &[8.0 / 12.0, -1.0 / 12.0]),
    (9.0 / 24.0, &[19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0]),
];

const fn bashforth(name: &'static str, order: usize) -> Multistep {
    Multistep { name, values: &[1.0], new_slope: 0.0, slopes: BASHFORTH[order - 1], predictor: &[] }
}

const fn moulton(name: &'static str, order: usize, predictor: &'static [f64]) -> Multistep {
    let (new_slope, slopes) = MOULTON[order - 2];
    Multistep { name, values: &[1.0], new_slope, slopes, predictor }
}

const fn backward(name: &'static str, values: &'static [f64], new_slope: f64) -> Multistep {
    Multistep { name, values, new_slope, slopes: &[], predictor: &[] }
}

const KNOWN: [Multistep; 13] = [
    bashforth("Adams and Bashforth's scheme of order 2", 2),
    bashforth("Adams and Bashforth's scheme of order 3", 3),
    bashforth("Adams and Bashforth's scheme of order 4", 4),
    moulton("Adams and Moulton's scheme of order 3", 3, &[]),
    moulton("Adams and Moulton's scheme of order 4", 4, &[]),
    moulton("the corrector of order 2 behind a predictor of order 2", 2, BASHFORTH[1]),
    moulton("the corrector of order 3 behind a predictor of order 2", 3, BASHFORTH[1]),
    moulton("the corrector of order 3 behind a predictor of order 3", 3, BASHFORTH[2]),
    moulton("the corrector of order 4 behind a predictor of order 3", 4, BASHFORTH[2]),
    moulton("the corrector of order 4 behind a predictor of order 4", 4, BASHFORTH[3]),
    backward("the backward differences of order 2", &[4.0 / 3.0, -1.0 / 3.0], 2.0 / 3.0),
    backward("the backward differences of order 3", &[18.0 / 11.0, -9.0 / 11.0, 2.0 / 11.0], 6.0 / 11.0),
    backward(
        "the backward differences of order 4",
        &[48.0 / 25.0, -36.0 / 25.0, 16.0 / 25.0, -3.0 / 25.0],
        12.0 / 25.0,
    ),
];

/// V at the ends of steps of size `r h` under `V' = -r V`.
pub(super) struct Steps {
    pub size: f64,
    /// The first is that at impact, 1 m/s.
    pub velocities: Vec<f64>,
    /// By how much `x + V` differs from V0, at most: by nothing, whatever the weights, where both have the same.
    pub off_path: f64,
}

impl Steps {
    /// By what a step multiplies V.
    pub(super) fn factor(&self, step: usize) -> f64 {
        self.velocities[step + 1] / self.velocities[step]
    }
}

/// By how much a change of one number may differ from step to step, and must differ from none.
const ONE_CHANGE: f64 = 1e-4;
const CHANGED: f64 = 1e-3;

impl Multistep {
    /// What V(n+1) has that this scheme does not give it, and what each of its numbers gives per unit.
    fn left(&self, steps: &Steps, n: usize) -> (f64, Vec<f64>) {
        let slope = |back: usize| -steps.size * steps.velocities[n - back];
        let each = |weights: &[f64], of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..weights.len()).map(of).collect() };
        let sum = |weights: &[f64], of: &[f64]| -> f64 { weights.iter().zip(of).map(|(weight, of)| weight * of).sum() };
        let (values, slopes) = (each(self.values, &|back| steps.velocities[n - back]), each(self.slopes, &slope));
        let foreseen = each(self.predictor, &slope);
        let new = match self.predictor {
            [] => steps.velocities[n + 1],
            predictor => steps.velocities[n] + sum(predictor, &foreseen),
        };
        let new_slope = -steps.size * new;
        let left = steps.velocities[n + 1]
            - sum(self.values, &values)
            - sum(self.slopes, &slopes)
            - self.new_slope * new_slope;
        let of_predictor = foreseen.into_iter().map(|slope| -steps.size * self.new_slope * slope);
        let of_new = (self.new_slope != 0.0).then_some(new_slope);
        (left, values.into_iter().chain(slopes).chain(of_new).chain(of_predictor).collect())
    }

    /// Its numbers in the order of [`Self::left`], and what each is called.
    fn numbers(&self) -> Vec<(f64, String)> {
        let listed = |of: &'static [f64], what: &'static str| {
            of.iter().enumerate().map(move |(back, number)| (*number, format!("{what} {} (the newest is 1)", back + 1)))
        };
        listed(self.values, "the weight of V")
            .chain(listed(self.slopes, "the weight of slope"))
            .chain((self.new_slope != 0.0).then(|| (self.new_slope, "the weight of the new slope".to_owned())))
            .chain(listed(self.predictor, "the predictor's weight of slope"))
            .collect()
    }

    /// The one number that is another, as a sentence.
    fn changed(&self, all: &[Steps; 2], started: usize) -> Option<String> {
        let left: Vec<(f64, Vec<f64>)> =
            all.iter().flat_map(|steps| (started..steps.velocities.len() - 1).map(|n| self.left(steps, n))).collect();
        self.numbers().into_iter().enumerate().find_map(|(which, (right, what))| {
            let changes: Vec<f64> = left.iter().map(|(left, of)| left / of[which]).collect();
            let mean = changes.iter().sum::<f64>() / changes.len() as f64;
            let is_one = changes.iter().all(|change| (change - mean).abs() <= ONE_CHANGE * mean.abs());
            let found = right + mean;
            (is_one && mean.abs() > CHANGED).then(|| format!("{what} is {found:.4}, not {right:.4}, in {}", self.name))
        })
    }
}

/// Which number of which known scheme, changed alone, gives all steps from `started` on, at both sizes.
pub(super) fn changed_number(all: &[Steps; 2], started: usize) -> Option<String> {
    KNOWN.iter().find_map(|scheme| scheme.changed(all, started))
}
