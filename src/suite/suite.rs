//! A suite: claims and scenes read from a file or shipped with the program, and the run that judges them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use serde::Deserialize;

use super::checks::{self, Context, Memo, PeerAnswers};
use super::claim::{Check, Claim, ClaimSpec, Judged, NotMeasured};
use super::verdict::{Counts, Verdict};
use crate::physics::Scene;
use crate::physics::SceneError;
use crate::physics::Shown;
use crate::physics::scene_file::{SHIPPED, did_you_mean, nearest, read_text};

/// The suite that ships.
pub const EMBEDDED: &str = include_str!("../../verification/suite.toml");

/// Scenes by the name that claims use.
#[derive(Clone, Debug, Default)]
pub struct Scenes(BTreeMap<String, Scene>);

impl Scenes {
    /// The scene `name`.
    pub fn get(&self, name: &str) -> Option<&Scene> {
        self.0.get(name)
    }

    /// Names and scenes, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Scene)> {
        self.0.iter().map(|(name, scene)| (name.as_str(), scene))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SuiteFile {
    title: String,
    claim: Vec<ClaimSpec>,
}

/// Claims with their scenes, ready to run.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Title for people.
    pub title: String,
    /// Whether this is the suite that ships.
    pub is_embedded: bool,
    /// The text it was read from, for the report's hash.
    pub text: String,
    /// Scenes.
    pub scenes: Scenes,
    /// The claims.
    pub claims: Vec<Claim>,
}

impl Suite {
    /// The suite that ships.
    ///
    /// # Errors
    /// Only if the shipped files are broken, which a test excludes.
    pub fn embedded() -> Result<Self, Box<SceneError>> {
        Self::from_toml(EMBEDDED, "verification/suite.toml", None).map(|suite| Self { is_embedded: true, ..suite })
    }

    /// The suite in the file at `path`; its scenes are files beside it, or shipped ones by name.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, column and remedy.
    pub fn read(path: &str) -> Result<Self, Box<SceneError>> {
        let (file, text) = read_text(Path::new(path))?;
        let folder = Path::new(path).parent().map(Path::to_path_buf).unwrap_or_default();
        Self::from_toml(&text, &file, Some(&folder))
    }

    fn from_toml(text: &str, file: &str, folder: Option<&Path>) -> Result<Self, Box<SceneError>> {
        let refuse = |span: Range<usize>, message: String, allowed: &str, help: &str| {
            SceneError::at(file, text, span, message, allowed, help)
        };
        let read: SuiteFile = toml::from_str(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            let (message, allowed, help) = told(error.message(), text.get(span.clone()).unwrap_or_default());
            refuse(span, message, &allowed, &help)
        })?;
        if read.claim.is_empty() {
            return Err(refuse(
                0..0,
                "the suite has no claim".to_owned(),
                "one [[claim]] or more",
                "copy one from `verification/suite.toml` of the project",
            ));
        }
        let mut scenes = Scenes::default();
        let mut claims: Vec<Claim> = Vec::new();
        let mut ids = BTreeSet::new();
        for spec in &read.claim {
            let id = spec.id.get_ref();
            if !ids.insert(id.clone()) {
                return Err(refuse(
                    spec.id.span(),
                    format!("the id `{id}` is taken"),
                    "an id of its own",
                    "rename one of the two claims",
                ));
            }
            let limit = *spec.limit.get_ref();
            if !(limit.is_finite() && limit >= 0.0) {
                return Err(refuse(
                    spec.limit.span(),
                    format!("a limit of {} decides nothing", Shown(limit)),
                    "a finite number, zero or above",
                    "write the largest value that you would accept",
                ));
            }
            for scene in &spec.scenes {
                let name = scene.get_ref();
                if scenes.0.contains_key(name) {
                    continue;
                }
                let shipped = SHIPPED.iter().find(|(shipped, _)| shipped == name);
                let found = match (shipped, folder) {
                    (Some((name, text)), _) => Scene::from_toml(text, &format!("verification/scenes/{name}.toml"))?,
                    (None, Some(folder)) if Path::new(name).extension().is_some_and(|e| e == "toml") => {
                        Scene::read(&folder.join(name))?
                    }
                    _ => {
                        let names: Vec<_> = SHIPPED.iter().map(|(name, _)| *name).collect();
                        return Err(refuse(
                            scene.span(),
                            format!("no scene `{name}` ships"),
                            "a file that ends in .toml, or a scene that ships",
                            &nearest(name, &names)
                                .map_or_else(|| format!("choose from {}", names.join(", ")), did_you_mean),
                        ));
                    }
                };
                scenes.0.insert(name.clone(), found);
            }
            claims.extend(spec.expand());
        }
        Ok(Self { title: read.title, is_embedded: false, text: text.to_owned(), scenes, claims })
    }

    /// Keeps the claims whose id contains `pattern`.
    pub fn only(&mut self, pattern: &str) {
        self.claims.retain(|claim| claim.id.contains(pattern));
    }

    /// Judges every claim, in parallel, in the suite's order; `done` is told of each as it is judged.
    pub fn run(&self, seed: u64, peers: &PeerAnswers, done: &(dyn Fn(&Judged) + Sync)) -> Vec<Judged> {
        let memo = Memo::default();
        let context = Context { scenes: &self.scenes, peers, memo: &memo, seed };
        self.claims
            .par_iter()
            .map(|claim| {
                let judged = judge(claim, context);
                done(&judged);
                judged
            })
            .collect()
    }
}

/// A reader's `message` on the text `at` in the words of scene files: what is wrong, what is allowed, what to do.
fn told(message: &str, at: &str) -> (String, String, String) {
    const COMPARE: &str = "compare with `verification/suite.toml` of the project, which uses every kind of claim";
    /// Longest list of words that is told in one line [bytes].
    const KNOWN_MAX: usize = 160;
    // The reader quotes names: the offending one first, those it expected behind it.
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match quoted[..] {
        [name, ref known @ ..] if message.starts_with("unknown ") && !known.is_empty() => {
            let help = nearest(name, known).map_or_else(|| COMPARE.to_owned(), did_you_mean);
            let mut known = known.join(", ");
            if known.len() > KNOWN_MAX {
                "a word of the suite that ships".clone_into(&mut known);
            }
            (format!("`{name}` is not known here"), format!("known: {known}"), help)
        }
        [name] if message.starts_with("missing field") => {
            (format!("`{name}` is missing"), format!("`{name}` is required here"), COMPARE.to_owned())
        }
        _ if message == "duplicate key" => {
            (format!("`{at}` is given twice"), "each key once".to_owned(), "remove one of the two".to_owned())
        }
        _ => {
            let message = message.replace("f64", "a number").replace("invalid type: ", "this is of another type: ");
            (message, "a suite in TOML".to_owned(), COMPARE.to_owned())
        }
    }
}

/// Verdict and counts of a run.
pub fn summary(judged: &[Judged]) -> (Verdict, Counts) {
    let counts = Counts::of(judged.iter().map(|j| j.verdict));
    (counts.verdict(), counts)
}

/// Measures one claim and holds it against its limit.
pub fn judge(claim: &Claim, context: Context<'_>) -> Judged {
    let started = Instant::now();
    let result = checks::measure(claim, context);
    let wall_ms = started.elapsed().as_secs_f64() * 1e3;
    let (verdict, measured, resolution, remark, evidence) = match result {
        Ok(found) => {
            let verdict = match found.verdict {
                Some(verdict) => verdict,
                None => Verdict::of(found.value, claim.limit),
            };
            (verdict, Some(found.value).filter(|v| v.is_finite()), found.resolution, found.remark, found.evidence)
        }
        Err(NotMeasured::NotApplicable(reason)) => (Verdict::Skipped, None, 0.0, reason, None),
        Err(NotMeasured::Broken(reason)) => (Verdict::Failed, None, 0.0, reason, None),
    };
    Judged { claim: claim.clone(), verdict, measured, resolution, remark, evidence, wall_ms }
}

/// Whether `check` needs another program's answers.
pub fn needs_peer(check: &Check) -> bool {
    matches!(check, Check::Peer { .. })
}
