//! A suite: claims and scenes read from a file or shipped with the program, and the run that judges them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde::Deserialize;

use super::checks::{Asked, Check, Context, Memo, PeerAnswers, Subject};
use super::claim::{Claim, ClaimSpec, Judged, NotMeasured, THINGS};
use super::program::Program;
use crate::exchange::SceneError;
use crate::exchange::decode::decode;
use crate::exchange::diagnostic::{Dialect, Fault, read_text};
use crate::exchange::scene_file::{shipped, shipped_like};
use crate::physics::{Problem, Scene, Shown};

/// Scenes by the name that claims use, each resolved once.
#[derive(Clone, Debug, Default)]
pub struct Scenes(BTreeMap<String, (Scene, Result<Problem, String>)>);

impl Scenes {
    /// The scene `name`.
    pub fn get(&self, name: &str) -> Option<&Scene> {
        self.0.get(name).map(|(scene, _)| scene)
    }

    /// The problem that the scene `name` describes.
    ///
    /// # Errors
    /// There is no such scene, or it does not resolve; in words.
    pub fn problem(&self, name: &str) -> Result<&Problem, String> {
        let (_, problem) = self.0.get(name).ok_or_else(|| format!("no scene {name}"))?;
        problem.as_ref().map_err(Clone::clone)
    }

    /// Names and scenes, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Scene)> {
        self.0.iter().map(|(name, (scene, _))| (name.as_str(), scene))
    }

    fn insert(&mut self, name: &str, scene: Scene) {
        let problem = scene.problem().map_err(|error| error.to_string());
        self.0.insert(name.to_owned(), (scene, problem));
    }
}

/// What a run of a suite is given besides its claims and scenes.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Seed of every random number.
    pub seed: u64,
    /// Answers of other programs.
    pub peers: &'a PeerAnswers,
    /// The program; without it, claims about its commands are skipped.
    pub program: Option<&'a Program>,
    /// Measured energies, (H/d, `E_c/(d³ fc)`), with which the paper's conclusions are tested.
    pub points: &'a [(f64, f64)],
}

/// A suite of claims for `penetrode verify`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "A suite of penetrode")]
struct SuiteFile {
    /// Title for people.
    title: String,
    /// The claims.
    #[schemars(length(min = 1))]
    claim: Vec<ClaimSpec>,
}

/// What helps with most mistakes.
const COMPARE: &str = "compare with `verification/suite.toml` of the project, which uses every kind of claim";

const DIALECT: Dialect = Dialect {
    root: "the suite",
    table: |path| if path == "claim" { "[[claim]]".to_owned() } else { format!("`{path}`") },
    remedy: |_| COMPARE.to_owned(),
    unknown: |_, _| COMPARE.to_owned(),
};

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
    /// Patterns of the claims that were kept; empty where all were.
    pub only: Vec<String>,
}

impl Suite {
    /// The suite that ships.
    ///
    /// # Errors
    /// Only if the shipped files are broken, which a test excludes.
    pub fn embedded() -> Result<Self, Box<SceneError>> {
        Self::from_toml(include_str!("../../verification/suite.toml"), "verification/suite.toml", None)
    }

    /// The edge cases: events, step sizes and range, the search for the critical velocity.
    ///
    /// # Errors
    /// Only if the shipped file is broken, which a test excludes.
    pub fn edges() -> Result<Self, Box<SceneError>> {
        Self::from_toml(include_str!("../../verification/edges.toml"), "verification/edges.toml", None)
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
        let refuse = |span, message: String, allowed: &str, help: &str| {
            Fault::new(span, message, allowed, help).in_file(file, text)
        };
        let read: SuiteFile = decode(text, &DIALECT).map_err(|fault| fault.in_file(file, text))?;
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
            if id.trim().is_empty() {
                return Err(refuse(spec.id.span(), "the id is empty".to_owned(), "a name", "name the claim"));
            }
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
            let unit = spec.check.get_ref().unit();
            if unit.starts_with("relative") && limit >= 1.0 {
                return Err(refuse(
                    spec.limit.span(),
                    format!("a relative difference of {} says nothing", Shown(limit)),
                    "a number below one",
                    "write the largest difference that you would accept",
                ));
            }
            if THINGS.contains(&unit) && limit >= 1.0 {
                return Err(refuse(
                    spec.limit.span(),
                    format!("a limit of {} lets wrong cases pass ({unit})", Shown(limit)),
                    "a number below one",
                    "write 0",
                ));
            }
            for scene in &spec.scenes {
                let name = scene.get_ref();
                if scenes.0.contains_key(name) {
                    continue;
                }
                let found = match (shipped(name), folder) {
                    (Some(text), _) => Scene::from_toml(text, &format!("verification/scenes/{name}.toml"))?,
                    (None, Some(folder)) if Path::new(name).extension().is_some_and(|e| e == "toml") => {
                        Scene::read(&folder.join(name))?
                    }
                    _ => {
                        return Err(refuse(
                            scene.span(),
                            format!("no scene `{name}` ships"),
                            "a file that ends in .toml, or a scene that ships",
                            &shipped_like(name, "`penetrode scenes` lists those that ship"),
                        ));
                    }
                };
                scenes.insert(name, found);
            }
            for claim in spec.expand() {
                // Where a table has one claim alone, its id is that of the table, which is taken already.
                if claim.id != *id && !ids.insert(claim.id.clone()) {
                    return Err(refuse(
                        spec.id.span(),
                        format!("the id `{}` is taken, as that of a claim of this table or of another", claim.id),
                        "claims with an id each",
                        "name each scene, method and quantity once, and rename one of the two",
                    ));
                }
                claims.push(claim);
            }
        }
        Ok(Self {
            title: read.title,
            is_embedded: folder.is_none(),
            text: text.to_owned(),
            scenes,
            claims,
            only: Vec::new(),
        })
    }

    /// The JSON schema (draft 7, which editors know best) of a suite file.
    pub fn schema() -> Schema {
        SchemaSettings::draft07().into_generator().into_root_schema_for::<SuiteFile>()
    }

    /// Keeps the claims whose id one of the `patterns` fits: as a part of the id, or, with `*` for any text and `?` for any
    /// character, as the whole of it.
    ///
    /// # Errors
    /// The first pattern that fits no claim.
    pub fn keep_only<'p>(&mut self, patterns: &'p [String]) -> Result<(), &'p str> {
        let fits_none = |pattern: &&String| !self.claims.iter().any(|claim| fits(pattern, &claim.id));
        if let Some(pattern) = patterns.iter().find(fits_none) {
            return Err(pattern);
        }
        self.claims.retain(|claim| patterns.iter().any(|pattern| fits(pattern, &claim.id)));
        self.only = patterns.to_vec();
        Ok(())
    }

    /// Judges every claim, in parallel, in the suite's order; `done` is called with each once it is judged.
    pub fn run(&self, inputs: Inputs<'_>, done: &(dyn Fn(&Judged) + Sync)) -> Vec<Judged> {
        let memo = Memo::default();
        let Inputs { seed, peers, program, points } = inputs;
        let context = Context { scenes: &self.scenes, peers, memo: &memo, program, points, judged: None, seed };
        let judge_those = |is_last, context| {
            let those = self.claims.iter().enumerate().filter(|(_, claim)| claim.check.is_last() == is_last);
            let (of_peers, others): (Vec<_>, Vec<_>) = those.partition(|(_, c)| matches!(c.check, Check::Peer(_)));
            let judge_one = |(place, claim)| {
                let judged = judge(Subject { claim, context, flaw: None, asked: &Asked::default() });
                done(&judged);
                (place, judged)
            };
            // A peer is asked in the order of the suite: the claim that meets its failure is the same in every run.
            let (mut judged, others) = rayon::join(
                || of_peers.into_iter().map(judge_one).collect::<Vec<_>>(),
                || others.into_par_iter().map(judge_one).collect::<Vec<_>>(),
            );
            judged.extend(others);
            judged.sort_unstable_by_key(|(place, _)| *place);
            judged
        };
        let (places, mut judged): (Vec<_>, Vec<_>) = judge_those(false, context).into_iter().unzip();
        let others = self.only.is_empty().then_some(judged.as_slice());
        let last = judge_those(true, Context { judged: others, ..context });
        for (inserted, (place, claim)) in last.into_iter().enumerate() {
            judged.insert(inserted + places.partition_point(|p| *p < place), claim);
        }
        judged
    }
}

/// Whether `pattern` fits `id`: see [`Suite::keep_only`].
fn fits(pattern: &str, id: &str) -> bool {
    if !pattern.contains(['*', '?']) {
        return id.contains(pattern);
    }
    let (pattern, id): (Vec<char>, Vec<char>) = (pattern.chars().collect(), id.chars().collect());
    // Places in both, and behind the last star the places from which it may take one character more.
    let (mut p, mut i, mut star) = (0, 0, None);
    while i < id.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, i));
                p += 1;
            }
            Some(symbol) if *symbol == '?' || *symbol == id[i] => (p, i) = (p + 1, i + 1),
            _ => match star {
                Some((at, taken)) => {
                    star = Some((at, taken + 1));
                    (p, i) = (at + 1, taken + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|symbol| *symbol == '*')
}

/// Measures one claim and compares it with its limit.
pub(super) fn judge(subject: Subject<'_>) -> Judged {
    let (started, claim) = (Instant::now(), subject.claim);
    let lacks = claim.method.filter(|method| !method.is_built());
    let found = match lacks {
        Some(method) => Err(NotMeasured::lacks(format!("this build leaves out {method}"))),
        None => claim.check.measure(&subject),
    };
    let found = found.and_then(|measured| match claim.not_asked(subject.asked) {
        Some((key, name)) => Err(NotMeasured::broken(format!("this check does not ask for {name}: remove `{key}`"))),
        None => Ok(measured),
    });
    Judged::new(claim.clone(), found, started.elapsed().as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn a_pattern_is_a_part_of_an_id_and_one_with_a_star_the_whole() {
        for (pattern, id, is_fitting) in [
            ("order", "exact/order/depth", true),
            ("exact/", "exact/order/depth", true),
            ("depth", "exact/order", false),
            ("*/depth", "exact/order/depth", true),
            ("*/order", "exact/order/depth", false),
            ("exact/*/d?pth", "exact/order/depth", true),
            ("exact/*", "inexact/order", false),
            ("*a*b", "aabab", true),
            ("*a*c", "aabab", false),
            ("?", "ab", false),
            ("**", "", true),
        ] {
            assert_eq!(fits(pattern, id), is_fitting, "{pattern} {id}");
        }
    }
}
