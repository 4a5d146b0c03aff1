//! What commands say, as it stands in `verification/transcript`: remade on request, and read again by a person.

#![expect(clippy::panic, reason = "a test that cannot be set up has failed")]

use std::path::Path;
use std::{env, fs};

use penetrode::suite::Program;
use penetrode::suite::transcript::{TRANSCRIPTS, Transcript};

/// `SNAPSHOTS=overwrite` writes what the runs say today; the claims `command/recorded` compare.
#[test]
fn every_transcript_is_written_as_it_is_read() {
    let program = Program::new(Path::new(env!("CARGO_BIN_EXE_penetrode"))).unwrap_or_else(|error| panic!("{error}"));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/transcript");
    for (name, _) in TRANSCRIPTS {
        let path = folder.join(format!("{name}.txt"));
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{error}"));
        let read = Transcript::read(&text).unwrap_or_else(|cause| panic!("{name}: {cause:?}"));
        assert!(!read.is_empty(), "{name}");
        if env::var("SNAPSHOTS").is_ok_and(|value| value == "overwrite") {
            let again = read.again(&program).unwrap_or_else(|cause| panic!("{name}: {cause:?}"));
            fs::write(&path, again.to_string()).unwrap_or_else(|error| panic!("{error}"));
        } else {
            assert_eq!(read.to_string(), text, "{name}: remake it with SNAPSHOTS=overwrite");
        }
    }
}
