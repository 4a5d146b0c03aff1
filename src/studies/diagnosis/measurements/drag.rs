//! The drag, speed by speed: a short flight through drag alone loses `ln(V0/V) = Q H / M` whatever the speed, so that the ratio of the
//! loss to that is the ratio of the force.

use super::super::causes::{Cause, Certainty};
use super::super::{Asking, TOLERANCES};
use super::{ONE_RATIO, ends};
use crate::exchange::peers::PeerRequest;
use crate::physics::{Problem, Stage};

/// Speeds at which the drag is measured: powers of ten, and how many in each decade.
const DECADES: [i32; 2] = [-1, 3];
const IN_A_DECADE: i32 = 4;
/// `ln(V0/V)` of the flights that measure it.
const LOSS: f64 = 0.01;
/// Speeds at which a constant force must be right beside it.
const BESIDE: [f64; 4] = [0.37, 5.3, 81.9, 1234.5];
/// Halvings of a bracket in which the ratio changes.
const HALVINGS: usize = 24;

/// Whether the drag is a factor times the right one that depends on the speed.
pub(super) fn measured(asking: &mut Asking<'_>) -> Option<Cause> {
    // The ratio at a speed, if answers at two tolerances agree on it.
    let mut of_stage = |speed: f64, stage: Stage| {
        let problem = Problem::of_stages(1.0, speed, [stage]).with_exit(1.0);
        let mut at = |rtol| {
            let [found, exact] = ends(asking, &problem, &PeerRequest::from_problem(&problem, rtol))?;
            Some((speed / found.velocity).ln() / (speed / exact.velocity).ln())
        };
        let (looser, tighter) = (at(TOLERANCES[1])?, at(TOLERANCES[2])?);
        ((looser - tighter).abs() <= 0.1 * (tighter - 1.0).abs() + ONE_RATIO).then_some(tighter)
    };
    let is_one = |a: f64, b: f64| (a - b).abs() <= ONE_RATIO * a.abs().max(b.abs()).max(1.0);
    // A speed that is read or reported wrongly shows under any force.
    let mut is_right = |speed: &f64| {
        let same_loss = Stage::tunnel(LOSS * speed * speed, 0.0);
        of_stage(*speed, same_loss).is_some_and(|ratio| is_one(ratio, 1.0))
    };
    if !BESIDE.iter().all(&mut is_right) {
        return None;
    }
    let mut ratio = |speed: f64| of_stage(speed, Stage::tunnel(0.0, LOSS));
    let speeds = (DECADES[0] * IN_A_DECADE..=DECADES[1] * IN_A_DECADE)
        .map(|power| 10f64.powf(f64::from(power) / f64::from(IN_A_DECADE)));
    let count = speeds.clone().count();
    let ratios: Vec<(f64, f64)> = speeds.filter_map(|speed| Some((speed, ratio(speed)?))).collect();
    if 4 * ratios.len() < 3 * count {
        return None;
    }
    if ratios.iter().all(|(_, ratio)| is_one(*ratio, 1.0)) {
        return None;
    }
    let off = ratios.iter().filter(|(_, ratio)| !is_one(*ratio, 1.0)).count();
    let of = ratios.len();
    let likely =
        |factor, statement| Some(Cause { factor, ..Cause::plain("term:drag", statement, Certainty::Likely, off, of) });
    let [(_, low), .., (_, high)] = ratios[..] else { return None };
    let below = ratios.iter().take_while(|(_, ratio)| is_one(*ratio, low)).count();
    let above = ratios.iter().rev().take_while(|(_, ratio)| is_one(*ratio, high)).count();
    let said =
        |ratio: f64| if is_one(ratio, 1.0) { "right".to_owned() } else { format!("{ratio:.6} times the right one") };
    // All these flights are one but for their unit of time: one ratio for all is that of any error.
    if below == ratios.len() {
        return None;
    }
    // One flight may pass the change on its way.
    if below + above + 1 >= ratios.len() {
        let (mut slow, mut fast) = (ratios[below - 1].0, ratios[below].0);
        for _ in 0..HALVINGS {
            let middle = (slow * fast).sqrt();
            // A step over the change may err at one tolerance and not at the other.
            if ratio(middle).is_some_and(|ratio| is_one(ratio, low)) { slow = middle } else { fast = middle }
        }
        let factor = if is_one(low, 1.0) { high } else { low };
        let statement = format!("the drag is {} above {fast:.4} m/s, and {} below", said(high), said(low));
        return likely(Some(factor), statement);
    }
    let worst = ratios.iter().copied().max_by(|a, b| (a.1 - 1.0).abs().total_cmp(&(b.1 - 1.0).abs()))?;
    let listed = [ratios[0], ratios[ratios.len() / 2], ratios[ratios.len() - 1], worst];
    let [a, b, c, worst] = listed.map(|(speed, ratio)| format!("{ratio:.6} at {speed:.4} m/s"));
    likely(None, format!("the drag is not q V²: over the right one it is {a}, {b} and {c}; most off is {worst}"))
}
