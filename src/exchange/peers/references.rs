//! Answers recorded earlier, with the program, its version, the tolerance and the recipe.
//!
//! Made by `python3 verification/references/record.py`; the files are part of the program.

use serde::Deserialize;

use super::wire::{PeerAnswer, PeerRequest};
use crate::physics::Problem;

const FILES: [&str; 4] = [
    include_str!("../../../verification/references/heyoka-taylor.json"),
    include_str!("../../../verification/references/sundae-adams.json"),
    include_str!("../../../verification/references/sundae-bdf.json"),
    include_str!("../../../verification/references/sundae-ida.json"),
];

/// What one program answered to every scene, and how to ask it again.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    /// Name of the program.
    pub program: String,
    /// Its version.
    pub version: String,
    /// Its method.
    pub method: String,
    /// Relative tolerance asked for.
    pub rtol: f64,
    /// The peer that was asked.
    pub command: String,
    /// The command that remakes the file.
    pub recipe: String,
    /// Day of the recording, `YYYY-MM-DD`.
    pub recorded: String,
    /// System, processor and Python.
    pub platform: String,
    /// Packages with their versions, as `pip` lists them.
    pub packages: Vec<String>,
    /// The flights.
    pub flights: Vec<RecordedFlight>,
}

/// One question and its answer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedFlight {
    /// Name of the scene.
    pub scene: String,
    /// What the scene shows.
    pub about: String,
    /// Index of the stage that ends at k d, if one does.
    pub crater: Option<usize>,
    /// What was asked.
    pub request: PeerRequest,
    /// What came back.
    pub answer: PeerAnswer,
}

impl RecordedFlight {
    /// The problem that was solved.
    pub fn problem(&self) -> Problem {
        self.request.problem(self.crater)
    }
}

impl Recording {
    /// Relative error, divided by the conditioning, up to which the program is to be believed on these scenes.
    ///
    /// SUNDIALS controls the error of a step, not of the flight: at 1e-12 it was found 2e-12 to 6.7e-11 off 40-digit
    /// values, so nothing tighter than a hundred tolerances is claimed with it. heyoka at 1e-15 was found at most
    /// 4.1e-15 off (before the division; 4e-16 after) and is taken at ten.
    pub fn trusted_to(&self) -> f64 {
        if self.program == "scikit-sundae" { 100.0 * self.rtol } else { 10.0 * self.rtol }
    }
}

/// Every recording.
///
/// # Errors
/// A file that is not a recording; a test reads them all, so the program that ships has none.
pub fn recordings() -> Result<Vec<Recording>, serde_json::Error> {
    FILES.iter().map(|text| serde_json::from_str(text)).collect()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
mod tests {
    use super::*;

    #[test]
    fn every_recording_says_where_it_comes_from() {
        let recordings = recordings().unwrap();
        assert_eq!(recordings.len(), 4);
        for recording in &recordings {
            for text in [&recording.version, &recording.method, &recording.platform, &recording.recorded] {
                assert!(!text.is_empty(), "{recording:?}");
            }
            assert!(recording.command.starts_with("python3 verification/peers/"));
            assert_eq!(recording.recipe, "python3 verification/references/record.py");
            assert!(!recording.packages.is_empty() && recording.packages.iter().all(|p| p.contains("==")));
        }
    }

    #[test]
    fn every_program_was_asked_the_same_scenes() {
        let recordings = recordings().unwrap();
        let scenes = |recording: &Recording| -> Vec<_> {
            recording.flights.iter().map(|f| (f.scene.clone(), f.problem())).collect()
        };
        let first = scenes(&recordings[0]);
        assert!(first.len() >= 7);
        assert!(recordings.iter().all(|recording| scenes(recording) == first));
    }

    /// Two unlike methods agree within the sum of what each is trusted to, and list the same events.
    #[test]
    fn recorded_programs_agree_within_their_combined_tolerance() {
        let recordings = recordings().unwrap();
        let (heyoka, others) = recordings.split_first().unwrap();
        for other in others {
            let limit = heyoka.trusted_to() + other.trusted_to();
            for (reference, flight) in heyoka.flights.iter().zip(&other.flights) {
                let kinds = |answer: &PeerAnswer| answer.events.iter().map(|e| e.kind).collect::<Vec<_>>();
                assert_eq!(kinds(&flight.answer), kinds(&reference.answer));
                let exact = reference.answer.flight(&reference.problem());
                let differences = flight.answer.differences_from(&exact, &reference.problem()).unwrap();
                for difference in differences {
                    let found = difference.relative / difference.conditioning;
                    assert!(found <= limit, "{} {}: {difference:?}", other.method, flight.scene);
                }
            }
        }
    }
}
