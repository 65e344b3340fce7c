"""Compiles the kernels that most tests use: `python -m tests.trainer.compile`, once after installing.

Numba keeps what it compiled beside the sources. Workers of pytest that start without it compile the same kernels at
the same time. Two processes: the kernels that play, and those that train.
"""

from __future__ import annotations

import sys
import tempfile
from multiprocessing import get_context
from pathlib import Path


def play() -> None:
    """What backend `cpu` runs, for Gaussians with skin weights and for embedded ones; each stage alone, too."""
    from avatar_runtime.conformance import conform
    from tests.conformance.avatars import AVATARS
    from tests.conformance.references import committed

    for name in ("skin_polar", "surface_area", "surface_joints"):
        conform(AVATARS[name](), committed(name), "cpu")


def train() -> None:
    """What every system trains with."""
    from tests.trainer import toy

    with tempfile.TemporaryDirectory() as folder:
        capture = toy.capture_folder(Path(folder) / "capture")
        sys.argv = ["avatar-train", "toy", str(capture), "--out", f"{folder}/run", "--iterations", "2"]
        toy.main()


def main() -> None:
    context = get_context("spawn")
    processes = [context.Process(target=work) for work in (play, train)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    sys.exit(any(process.exitcode for process in processes))


if __name__ == "__main__":
    main()
