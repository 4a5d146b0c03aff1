//! Is a law that is written as text solved as what it says? Beside the same terms in code, in plain steps of Runge and Kutta.

use super::Subject;
use super::edges::Violations;
use crate::integrators::Detail;
use crate::physics::{Outcome, Scene};
use crate::studies::random::Random;
use crate::suite::claim::{Found, NotMeasured};

check! {
    /// Random laws as text, polynomials and others, some of which drive on a part of the way: outcome, depth, time and velocity
    /// of the end and the exit margin, beside 20,000 equal steps with the force computed of its terms.
    GeneratedLaws {
        /// How many laws.
        #[serde(deserialize_with = "crate::suite::checks::count")]
        laws: usize,
    } in Model, "violations", counting generated_laws, compares (Method | Elsewhere);
}

/// Mass (kg).
const MASS: f64 = 2.0;
/// Unit of force (N).
const P: f64 = 3e5;
/// Unit of length (m).
const L: f64 = 0.2;
/// Unit of velocity (m/s).
const V1: f64 = 200.0;

/// A term as text and as the number that it says, of x/l and V/v1.
type Term = (&'static str, fn(f64, f64) -> f64);

/// What coefficients of a stage can say.
const POLYNOMIALS: [Term; 9] = [
    ("x/l", |x, _| x),
    ("V/v1", |_, v| v),
    ("(V/v1)^2", |_, v| v * v),
    ("V*V/v1^2", |_, v| v * v),
    ("(x/l - 0.5)", |x, _| x - 0.5),
    ("(0.5 + V/v1)*(1 + 0.7*V/v1)", |_, v| (0.5 + v) * (1.0 + 0.7 * v)),
    ("(0.3 + V/v1)^2", |_, v| (0.3 + v) * (0.3 + v)),
    ("(V/v1 - (0.2 + x/l))/0.8", |x, v| (v - (0.2 + x)) / 0.8),
    ("((1 + x/l)*(1 - x/l) + x/l*x/l)", |_, _| 1.0),
];

/// What they cannot.
const OTHERS: [Term; 16] = [
    ("(V/v1)^1.5", |_, v| v.powf(1.5)),
    ("tanh(3*x/l)", |x, _| (3.0 * x).tanh()),
    ("exp(-V/v1)", |_, v| (-v).exp()),
    ("log(1 + V/v1)", |_, v| v.ln_1p()),
    ("log10(2 + x/l)", |x, _| (2.0 + x).log10()),
    ("sqrt(1 + x/l)", |x, _| (1.0 + x).sqrt()),
    ("sin(4*x/l)", |x, _| (4.0 * x).sin()),
    ("cos(3*V/v1)", |_, v| (3.0 * v).cos()),
    ("min(V/v1, x/l)", |x, v| v.min(x)),
    ("max(0.6 - x/l, 0)", |x, _| (0.6 - x).max(0.0)),
    ("abs(x/l - 0.4)", |x, _| (x - 0.4).abs()),
    ("atan(2*V/v1)", |_, v| (2.0 * v).atan()),
    ("(1 + V/v1)^-0.75", |_, v| (1.0 + v).powf(-0.75)),
    ("x*V/(l*v1)", |x, v| x * v),
    ("(1 + 0.4*x/l)*(0.5 + V/v1)", |x, v| (1.0 + 0.4 * x) * (0.5 + v)),
    ("(0.6 + x/l)*(1 - 0.5*x/l)", |x, _| (0.6 + x) * (1.0 - 0.5 * x)),
];

/// What runs away comes to this velocity (m/s).
const RUNAWAY: f64 = 1e9;

/// A narrow place, which resists or drives.
const NARROW: Term = ("exp(-((x/l - 0.35)/0.04)^2)", |x, _| (-((x - 0.35) / 0.04).powi(2)).exp());

/// A force, over P.
struct Law(Vec<(f64, Term)>);

impl Law {
    fn random(random: &mut Random) -> Self {
        let is_polynomial = random.chance(0.35);
        let terms: &[Term] = if is_polynomial { &POLYNOMIALS } else { &OTHERS };
        let mut law = vec![(random.uniform(0.8, 1.6), ("1", (|_, _| 1.0) as fn(f64, f64) -> f64))];
        for _ in 0..2 + random.below(3) {
            law.push((random.uniform(-0.5, 0.6), terms[random.below(terms.len())]));
        }
        if !is_polynomial && random.chance(0.4) {
            law.push((random.uniform(-4.0, 6.0), NARROW));
        }
        Self(law)
    }

    fn text(&self) -> String {
        let term = |&(factor, (text, _)): &(f64, Term)| {
            format!("{} {:?}*{text}", if factor < 0.0 { '-' } else { '+' }, factor.abs())
        };
        format!("P*(0 {})", self.0.iter().map(term).collect::<Vec<_>>().join(" "))
    }

    /// Acceleration (m/s²) at x (m) and V (m/s).
    fn acceleration(&self, x: f64, v: f64) -> f64 {
        // Beyond rest a power of V has no value; the step that comes to rest looks no further than a part of itself.
        let v = v.max(0.0);
        -P / MASS * self.0.iter().map(|(factor, (_, of))| factor * of(x / L, v / V1)).sum::<f64>()
    }

    /// x and V after a step of Runge and Kutta's rule.
    fn step(&self, (x, v): (f64, f64), h: f64) -> (f64, f64) {
        let slope = |part: f64, (dx, dv): (f64, f64)| {
            let (x, v) = (x + part * h * dx, v + part * h * dv);
            (v, self.acceleration(x, v))
        };
        let a = slope(0.0, (0.0, 0.0));
        let b = slope(0.5, a);
        let c = slope(0.5, b);
        let d = slope(1.0, c);
        (x + h / 6.0 * (a.0 + 2.0 * (b.0 + c.0) + d.0), v + h / 6.0 * (a.1 + 2.0 * (b.1 + c.1) + d.1))
    }

    /// Time, depth and velocity of the end, and the least V² behind the impact: that where V stops falling, or that of the end.
    /// All are infinite where V grows beyond all numbers; `None` where the steps do not get to an end.
    fn flight(&self, speed: f64, exit: f64) -> Option<([f64; 3], f64)> {
        const STEPS: u32 = 20_000;
        let h = 2.0 * MASS * speed / P / f64::from(STEPS);
        let (mut at, mut least) = ((0.0, speed), f64::INFINITY);
        let falls = |(x, v)| self.acceleration(x, v) < 0.0;
        for count in 0..4 * STEPS {
            let next = self.step(at, h);
            // Of what runs away plain steps follow the first decades alone.
            if !(next.0.is_finite() && next.1 < RUNAWAY) {
                return Some(([f64::INFINITY; 3], f64::INFINITY));
            }
            if next.1 <= 0.0 || next.0 >= exit {
                // The part of the step to the end, by Newton's rule.
                let mut part = 0.5;
                for _ in 0..20 {
                    let (x, v) = self.step(at, part * h);
                    part -= if next.1 <= 0.0 { v / (h * self.acceleration(x, v)) } else { (x - exit) / (h * v) };
                    part = part.clamp(0.0, 1.0);
                }
                let (x, v) = self.step(at, part * h);
                let v = if next.1 <= 0.0 { 0.0 } else { v };
                return Some(([h * (f64::from(count) + part), x, v], least.min(v * v)));
            }
            // The impact itself is no place where it nearly stops.
            if falls(at) && !falls(next) {
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..40 {
                    let part = 0.5 * (low + high);
                    if falls(self.step(at, part * h)) { low = part } else { high = part }
                }
                let slowest = self.step(at, high * h).1;
                least = least.min(slowest * slowest);
            }
            at = next;
        }
        None
    }
}

fn generated_laws(&GeneratedLaws { laws }: &GeneratedLaws, subject: &Subject<'_>, seen: &mut Violations) -> Found<()> {
    /// Error of the steps where a kink falls inside one, with room.
    const STEPS: f64 = 1e-7;
    let mut random = subject.random("generated laws");
    let allowed = STEPS.max(10.0 * subject.promise());
    let mut judged = 0;
    for _ in 0..laws {
        let (law, speed) = (Law::random(&mut random), random.uniform(60.0, 400.0));
        let exit = if random.chance(0.6) { random.uniform(0.02, 0.3) } else { f64::INFINITY };
        let target = if exit < f64::INFINITY { format!("target.thickness = {exit:?}\n") } else { String::new() };
        let force = law.text();
        // What no force uses is refused.
        let length =
            if force.contains("/l") || force.contains("(l") { format!("l = \"{L} m\"\n") } else { String::new() };
        let unit = if force.contains('V') { format!("v1 = \"{V1} m/s\"\n") } else { String::new() };
        let text = format!(
            "projectile.mass = {MASS}\nimpact.velocity = {speed:?}\n{target}[parameters]\nP = \"{P} N\"\n{length}{unit}\
             [[stage]]\nforce = \"{force}\"\n"
        );
        let scene =
            Scene::from_toml(&text, "a generated law").map_err(|error| NotMeasured::broken(error.to_string()))?;
        let Some(([time, depth, velocity], least)) = law.flight(speed, exit) else { continue };
        if time == f64::INFINITY {
            let flight = subject.method(None)?.integrator().solve(&scene.problem()?, Detail::End);
            seen.expect(flight.is_err(), || format!("V0 = {speed} m/s, {force}: {flight:?}, and it runs away"));
            continue;
        }
        let scale = speed * speed;
        // Nearly a touch: what is decided hangs on the last digits.
        if (velocity > 0.0 && least < 1e-4 * scale) || (velocity == 0.0 && depth > (1.0 - 1e-4) * exit) {
            continue;
        }
        let flight = match subject.flight(&scene.problem()?) {
            // Not all methods take viscous stages.
            Err(why) if why.is_skipped() => continue,
            flight => flight?,
        };
        judged += 1;
        let end = flight.end;
        let is_through = velocity > 0.0;
        let said = || {
            format!(
                "V0 = {speed} m/s, H = {exit} m, {force}: {end}, in plain steps {time} s, {depth} m, {velocity} m/s"
            )
        };
        seen.expect((flight.outcome == Outcome::Perforated) == is_through, said);
        let near = |found: f64, exact: f64, scale: f64| (found - exact).abs() <= allowed * scale;
        seen.expect(
            near(end.time, time, time) && near(end.depth, depth, depth) && near(end.velocity, velocity, speed),
            said,
        );
        if let Some(margin) = flight.exit_margin {
            let is_right = if is_through { near(margin, least / scale, 1.0) } else { margin < 0.0 };
            seen.expect(is_right, || format!("margin {margin}, least {}; {}", least / scale, said()));
        }
    }
    holds!(2 * judged > laws, "{judged} of {laws} laws came to an end");
    Ok(())
}
