"""What the tests share."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import penetrode as pn

# The command that the tests are told of, built apart from the package; else the one that came with it.
PROGRAM = os.environ.get("PENETRODE_COMMAND") or shutil.which("penetrode", path=str(Path(sys.executable).parent))

# Laws of their own are not told to peers, and some methods do not take them; every scene is solved by the default one.
SCENES = pn.scene_names()


@pytest.fixture
def command():
    """The command: its standard output; the exit code must be among those allowed."""

    def run(*words, codes=(0,), cwd=None):
        done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, cwd=cwd, check=False)
        assert done.returncode in codes, done.stderr
        return done.stdout

    return run


@pytest.fixture
def ask(command):
    """What the command prints as JSON."""
    return lambda *words, codes=(0, 3, 4), cwd=None: json.loads(command(*words, "--json", codes=codes, cwd=cwd))
