"""One target under atheris: `python -m tools.fuzz.guided_target TARGET SECONDS FOLDER`. It ends at a finding."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

PACKAGES = ("avatar_runtime", "avatar_export")


def main() -> None:
    """Attack until the time is over."""
    atheris = importlib.import_module("atheris")
    with atheris.instrument_imports(include=list(PACKAGES)):
        attacks = importlib.import_module("tools.fuzz.attack")
        guided = importlib.import_module("tools.fuzz.guided")
    name, seconds, folder = sys.argv[1:]
    arena = attacks.Arena(name, Path(folder))

    def one(data: bytes) -> None:
        outcome = attacks.attack_with(arena, guided.Draws(data), attacks.CORPUS)
        assert not outcome.text, outcome.text

    options = [
        sys.argv[0],
        f"-max_total_time={seconds}",
        "-max_len=600",
        "-len_control=0",
        "-print_final_stats=1",
    ]
    atheris.Setup([*options, f"-artifact_prefix={folder}/"], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
