"""Runs a program with Wine and ends what is left of it: `reaper.py SECONDS WINESERVER PROGRAM ...`.

Wine's server and services are no children of the program that starts them. They become this process's, so that none
outlives it and all that they cost is counted. Exit code 124: the time was over.
"""

import contextlib
import ctypes
import os
import subprocess
import sys

PR_SET_CHILD_SUBREAPER = 36


def main() -> int:
    limit_s, server, *command = sys.argv[1:]
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    try:
        code = subprocess.run(command, timeout=float(limit_s), check=False).returncode
    except subprocess.TimeoutExpired:
        code = 124
    subprocess.run([server, "-k"], check=False)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
    return code


if __name__ == "__main__":
    sys.exit(main())
