"""Does the JSON of each command conform to its published schema, and do those of files take what they should and no more?

Usage: schemas.py FOLDER, where `cargo test` left the schema and the answers of each command, or files: see `tests/it/schemas.rs`
and `conforms` in `tests/it/program.rs`. What must not conform ends with `.refused`. Needs jsonschema, which
`python/requirements.txt` pins.
"""

import json
import sys
from pathlib import Path

from jsonschema.validators import validator_for


def said(fault):
    """Where, and what, without the whole of a long value."""
    return f"{fault.json_path}: {fault.message[:300]}"


def main(folder):
    faults = []
    commands = sorted(path for path in folder.iterdir() if path.is_dir())
    if not commands:
        faults.append(f"{folder}: no answers; run `cargo test` first")
    for command in commands:
        schema = json.loads((command / "schema").read_bytes())
        kind = validator_for(schema, default=None)
        kind.check_schema(schema)
        validator = kind(schema)
        answers = sorted(command.glob("*.json"))
        refused = sorted(command.glob("*.refused"))
        if not answers:
            faults.append(f"{command}: no answer")
        for path in answers:
            answer = json.loads(path.read_bytes())
            if not validator.is_valid(answer):
                faults += (f"{path}: {said(fault)}" for fault in validator.iter_errors(answer))
        faults += (f"{path}: is taken" for path in refused if validator.is_valid(json.loads(path.read_bytes())))
        print(f"{len(answers):5} answers of {command.name}" + (f", {len(refused)} refused" if refused else ""))
    if faults:
        sys.exit("\n".join([*faults, f"(if an older build left them: remove {folder}, run `cargo test`)"]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
