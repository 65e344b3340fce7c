"""`avatar-train`, and `python -m avatar_trainer`."""

from __future__ import annotations

import importlib.util
import sys

NEEDED = ("torch", "numba", "tensorboard")


def main() -> None:
    """Entry point; one line and exit code 2 where a library of the trainer is not installed."""
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        print(
            f'avatar-train: needs {", ".join(missing)}: pip install "avatar-export[train]"', file=sys.stderr
        )
        sys.exit(2)
    from avatar_trainer import cli  # imports torch

    cli.main()


if __name__ == "__main__":
    main()
