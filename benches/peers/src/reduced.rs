//! What every solver is given: a flight as a chain of stages, each with one smooth law, restarted at each boundary.
//!
//! ```text
//! dxi/dtau = u,  du/dtau = -(p + s xi + r u + q u²),  until xi = distance or u = 0
//! ```
//!
//! in units of the first boundary L, of V0 and of L/V0, so that one tolerance serves depth and speed.

use penetrode::physics::{Problem, State};

/// The law of a stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct Law {
    pub p: f64,
    pub s: f64,
    pub r: f64,
    pub q: f64,
}

impl Law {
    #[inline]
    pub fn rate(&self, xi: f64, u: f64) -> f64 {
        -(self.p + self.s * xi + (self.r + self.q * u) * u)
    }

    /// First three derivatives of u.
    fn derivatives(&self, node: Node) -> [f64; 3] {
        let u = node.u;
        let a = self.rate(node.xi, u);
        let b = -(self.s * u + (self.r + 2.0 * self.q * u) * a);
        let c = -(self.s * a + (self.r + 2.0 * self.q * u) * b + 2.0 * self.q * a * a);
        [a, b, c]
    }

    /// The longest step that cannot hide a boundary crossed and crossed back.
    pub fn longest_step(&self) -> f64 {
        if self.s > 0.0 && self.r * self.r < 4.0 * self.s { 1.0 / self.s.sqrt() } else { 1e6 }
    }
}

/// A stage from xi = 0 at speed `speed`.
#[derive(Clone, Copy, Debug)]
pub struct Reduced {
    pub law: Law,
    pub distance: f64,
    pub speed: f64,
}

/// A state within a stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node {
    pub time: f64,
    pub xi: f64,
    pub u: f64,
}

impl Node {
    pub fn is_finite(self) -> bool {
        self.time.is_finite() && self.xi.is_finite() && self.u.is_finite()
    }

    /// Whether an event lies at or before it.
    pub fn is_past(self, stage: &Reduced) -> bool {
        self.u <= 0.0 || self.xi >= stage.distance
    }
}

/// How a stage ended.
#[derive(Clone, Copy, Debug)]
pub struct StageEnd {
    pub at: Node,
    pub rests: bool,
}

/// A flight: what is compared.
#[derive(Clone, Copy, Debug)]
pub struct Solved {
    pub perforated: bool,
    pub first_boundary: Option<State>,
    pub end: State,
}

/// Solves `problem` stage by stage.
pub fn chain(
    problem: &Problem,
    mut solve_stage: impl FnMut(&Reduced) -> Result<StageEnd, String>,
) -> Result<Solved, String> {
    let speed = problem.impact_speed;
    let ends = problem.stages.iter().map(|stage| stage.end).chain([problem.exit_depth]);
    let length = ends.filter(|end| *end > 0.0 && end.is_finite()).fold(f64::INFINITY, f64::min);
    let length = if length.is_finite() { length } else { 1.0 };
    let mut at = State { time: 0.0, depth: 0.0, velocity: speed };
    let mut first_boundary = None;
    for (index, stage) in problem.stages.iter().enumerate() {
        let limit = problem.limit_of(index);
        if limit <= at.depth {
            continue;
        }
        let m = problem.mass;
        let law = Law {
            p: (stage.static_force + stage.stiffness * at.depth) / m * length / (speed * speed),
            s: stage.stiffness / m * (length / speed).powi(2),
            r: stage.viscosity / m * length / speed,
            q: stage.drag / m * length,
        };
        let end = solve_stage(&Reduced { law, distance: (limit - at.depth) / length, speed: at.velocity / speed })?;
        at = State {
            time: at.time + end.at.time * length / speed,
            depth: if end.rests { at.depth + end.at.xi * length } else { limit },
            velocity: if end.rests { 0.0 } else { end.at.u * speed },
        };
        if end.rests {
            return Ok(Solved { perforated: false, first_boundary, end: at });
        }
        if limit == problem.exit_depth {
            return Ok(Solved { perforated: true, first_boundary, end: at });
        }
        first_boundary = first_boundary.or(Some(at));
    }
    Err("no event".to_owned())
}

/// The event between `before` and `after`, for solvers without an interpolant to trust: `advance` integrates from
/// `before` over a time, with the solver's own method and tolerance.
///
/// Rest comes first; a boundary behind the place of rest is crossed before it, exactly once.
pub fn locate(
    stage: &Reduced,
    before: Node,
    after: Node,
    mut advance: impl FnMut(f64) -> Result<Node, String>,
) -> Result<StageEnd, String> {
    let mut last = after;
    if after.u <= 0.0 {
        let rest = newton(stage, before, after, |node| node.u, 0, &mut advance)?;
        if rest.xi < stage.distance {
            return Ok(StageEnd { at: Node { u: 0.0, ..rest }, rests: true });
        }
        last = rest;
    }
    let at = newton(stage, before, last, |node| node.xi - stage.distance, 1, &mut advance)?;
    Ok(StageEnd { at: Node { u: at.u.max(0.0), ..at }, rests: false })
}

/// A root of `value` between two nodes: cubic Hermite for the guess, then integration to it, then the law's own
/// derivatives for the rest of the distance.
fn newton(
    stage: &Reduced,
    before: Node,
    after: Node,
    value: impl Fn(Node) -> f64,
    order: usize,
    advance: &mut impl FnMut(f64) -> Result<Node, String>,
) -> Result<Node, String> {
    let span = after.time - before.time;
    if span <= 0.0 {
        return Ok(after);
    }
    let slope = |node: Node| if order == 0 { stage.law.rate(node.xi, node.u) } else { node.u };
    let (f0, f1, d0, d1) = (value(before), value(after), slope(before) * span, slope(after) * span);
    let hermite = |t: f64| {
        let (a, b) = (2.0 * (f0 - f1) + d0 + d1, -3.0 * (f0 - f1) - 2.0 * d0 - d1);
        ((a * t + b) * t + d0) * t + f0
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if (hermite(middle) > 0.0) == (f0 > 0.0) { low = middle } else { high = middle }
    }
    let mut time = 0.5 * (low + high) * span;
    let mut node = before;
    for _ in 0..8 {
        node = advance(time)?;
        let [a, b, c] = stage.law.derivatives(node);
        // Newton on the Taylor polynomial of xi or u around the node.
        let mut delta = 0.0_f64;
        for _ in 0..20 {
            let u = node.u + delta * (a + delta * (b / 2.0 + delta * c / 6.0));
            let du = a + delta * (b + delta * c / 2.0);
            let xi = node.xi + delta * (node.u + delta * (a / 2.0 + delta * (b / 6.0 + delta * c / 24.0)));
            let (f, slope) = if order == 0 { (u, du) } else { (xi - stage.distance, u) };
            let step = f / slope;
            if !step.is_finite() {
                break;
            }
            delta = (delta - step).clamp(-time, span - time);
            if step.abs() <= 1e-17 * span {
                break;
            }
        }
        time += delta;
        node = Node {
            time: before.time + time,
            xi: node.xi + delta * (node.u + delta * (a / 2.0 + delta * (b / 6.0 + delta * c / 24.0))),
            u: node.u + delta * (a + delta * (b / 2.0 + delta * c / 6.0)),
        };
        if delta.abs() <= 1e-4 * span {
            return Ok(node);
        }
    }
    if node.is_finite() { Ok(node) } else { Err("the event was not located".to_owned()) }
}
