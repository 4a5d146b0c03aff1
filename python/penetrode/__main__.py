"""The command ``penetrode``."""

from __future__ import annotations

import os
import shutil
import signal
import sys

from ._penetrode import run


def main() -> int:
    """Run the command with the arguments of this process; returns its exit code."""
    # The program's own handlers end peers and remove what is half written.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    program = shutil.which("penetrode", path=os.path.dirname(sys.executable)) or os.path.abspath(sys.argv[0])
    return run(["penetrode", *sys.argv[1:]], program)


if __name__ == "__main__":
    sys.exit(main())
