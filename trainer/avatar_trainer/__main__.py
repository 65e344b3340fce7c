"""`avatar-train`, and `python -m avatar_trainer`."""

from __future__ import annotations

import importlib.util
import os
import sys

from avatar_export.commands import memory, process
from avatar_schema import extras

NEEDED = ("torch", "numba", "tensorboard")


def main() -> None:
    """Entry point; one line and exit code 2 if a library of the trainer is not installed."""
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        print(f"avatar-train: needs {', '.join(missing)}: {extras.how_to_install('train')}", file=sys.stderr)
        sys.exit(2)
    # torch and Numba each have a pool of threads that spins while it waits by default. The pools take the cores from
    # each other, and an iteration takes several times as long. Read once, when the first of them is loaded.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    process.start("avatar-train", "avatar_trainer.cli", memory.TRAIN)


if __name__ == "__main__":
    main()
