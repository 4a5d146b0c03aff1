//! A suite: claims and scenes read from a file or shipped with the program, and the run that judges them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use serde::Deserialize;

use super::checks::{self, Context, PeerAnswers};
use super::claim::{Check, Claim, ClaimSpec, Judged, NotMeasured};
use super::verdict::{Counts, Verdict};
use crate::physics::Scene;
use crate::physics::scene_file::{SceneError, SourceText};

/// The suite that ships.
pub const EMBEDDED: &str = include_str!("../../verification/suite.toml");

/// The scenes that ship, by name.
pub const SCENES: [(&str, &str); 9] = [
    ("crater", include_str!("../../verification/scenes/crater.toml")),
    ("tunnel", include_str!("../../verification/scenes/tunnel.toml")),
    ("perforate", include_str!("../../verification/scenes/perforate.toml")),
    ("graze", include_str!("../../verification/scenes/graze.toml")),
    ("forrestal-1994-shot-14", include_str!("../../verification/scenes/forrestal-1994-shot-14.toml")),
    ("paper-slab", include_str!("../../verification/scenes/paper-slab.toml")),
    ("stiff", include_str!("../../verification/scenes/stiff.toml")),
    ("viscous", include_str!("../../verification/scenes/viscous.toml")),
    ("layered", include_str!("../../verification/scenes/layered.toml")),
];

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
    pub fn embedded() -> Result<Self, SceneError> {
        Self::from_toml(EMBEDDED, "verification/suite.toml", None).map(|suite| Self { is_embedded: true, ..suite })
    }

    /// The suite in the file at `path`; its scenes are files beside it, or shipped ones by name.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, column and remedy.
    pub fn read(path: &str) -> Result<Self, SceneError> {
        let text = SourceText::read(path)?;
        let folder = Path::new(path).parent().map(Path::to_path_buf);
        Self::from_toml(&text, path, folder)
    }

    fn from_toml(text: &str, name: &str, folder: Option<PathBuf>) -> Result<Self, SceneError> {
        let refuse = |span: std::ops::Range<usize>, message: String, help: &str| {
            SceneError::at(name, text, span, message, help)
        };
        let file: SuiteFile = toml::from_str(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            refuse(span, error.message().to_owned(), "see `verification/suite.toml` of the project for every kind of claim")
        })?;
        let mut scenes = Scenes::default();
        let mut claims: Vec<Claim> = Vec::new();
        let mut ids = BTreeMap::new();
        for spec in &file.claim {
            if let Some(_first) = ids.insert(spec.id.get_ref().clone(), spec.id.span()) {
                return Err(refuse(spec.id.span(), format!("the id `{}` is taken", spec.id.get_ref()), "give each claim an id of its own"));
            }
            let limit = *spec.limit.get_ref();
            if !(limit.is_finite() && limit >= 0.0) {
                return Err(refuse(spec.limit.span(), format!("a limit of {limit} decides nothing"), "write a finite number, zero or above"));
            }
            for scene in &spec.scenes {
                let key = scene.get_ref();
                if scenes.0.contains_key(key) {
                    continue;
                }
                let read = match SCENES.iter().find(|(name, _)| name == key) {
                    Some((name, text)) => Scene::from_toml(text, &format!("verification/scenes/{name}.toml"))?,
                    None if folder.is_some() || key.ends_with(".toml") => {
                        let path = folder.clone().unwrap_or_default().join(key);
                        Scene::read(&path.to_string_lossy())?
                    }
                    None => {
                        let names: Vec<_> = SCENES.iter().map(|(name, _)| *name).collect();
                        return Err(refuse(scene.span(), format!("no scene `{key}` ships"), &format!("name a file beside the suite, or one of {}", names.join(", "))));
                    }
                };
                scenes.0.insert(key.clone(), read);
            }
            claims.extend(spec.expand());
        }
        Ok(Self { title: file.title, is_embedded: false, text: text.to_owned(), scenes, claims })
    }

    /// Keeps the claims whose id contains `pattern`.
    pub fn only(&mut self, pattern: &str) {
        self.claims.retain(|claim| claim.id.contains(pattern));
    }

    /// Judges every claim, in parallel, in the suite's order; `done` is told of each as it is judged.
    pub fn run(&self, seed: u64, peers: &PeerAnswers, done: &(dyn Fn(&Judged) + Sync)) -> Vec<Judged> {
        let context = Context { scenes: &self.scenes, peers, seed };
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
