//! Does the JSON of each command conform to its published schema, and do those of files take what they should and no more?
//!
//! Usage: `penetrode-schemas FOLDER`, where `cargo test` left the schema and the answers of each command, or files: see
//! `tests/it/schemas.rs` and `conforms` in `tests/it/program.rs`. What must not conform ends with `.refused`.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use serde_json::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).ok_or("usage: penetrode-schemas FOLDER")?;
    let mut faults = Vec::new();
    for command in fs::read_dir(&folder).map_err(|error| format!("{folder}: {error}; run `cargo test` first"))? {
        let command = command?.path();
        let schema = json(&command.join("schema"))?;
        let validator = jsonschema::validator_for(&schema)?;
        let (mut answers, mut refused) = (0, 0);
        for answer in fs::read_dir(&command)? {
            let path = answer?.path();
            if path.extension().is_some_and(|ending| ending == "refused") {
                refused += 1;
                if validator.is_valid(&json(&path)?) {
                    faults.push(format!("{}: is taken", path.display()));
                }
            } else if path.extension().is_some() {
                answers += 1;
                let answer = json(&path)?;
                faults.extend(validator.iter_errors(&answer).map(|fault| format!("{}: {fault}", path.display())));
            }
        }
        let refused = if refused > 0 { format!(", {refused} refused") } else { String::new() };
        println!("{answers:5} answers of {}{refused}", command.file_name().unwrap_or_default().display());
        if answers == 0 {
            faults.push(format!("{}: no answer", command.display()));
        }
    }
    if faults.is_empty() {
        return Ok(());
    }
    Err(format!("{}\n(if an older build left them: remove {folder}, run `cargo test`)", faults.join("\n")).into())
}

fn json(path: &Path) -> Result<Value, Box<dyn Error>> {
    let text = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(serde_json::from_slice(&text)?)
}
