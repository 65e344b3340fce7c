"""Compiles the kernels that most tests use: `python -m tools.compile_kernels`, once after installing.

Numba keeps what it compiled beside the sources. Workers of pytest that start without it compile the same kernels at
the same time. Two processes: one runs what plays an avatar and the tests of ASM fits, one the tests of training.
"""

from __future__ import annotations

import sys
from multiprocessing import get_context

TRAIN = (
    *("raster/test_cpu.py", "raster/test_points.py", "kernels", "captures/test_mesh_raster.py"),
    *("systems/gaussian_blendshapes/test_system.py", "systems/splatting_avatar", "systems/psavatar"),
)
FIT = ("asm/kernels", "asm/test_model.py", "asm/test_template.py", "asm/views/test_energies.py")


def play() -> None:
    """What backend `cpu` runs, for Gaussians with skin weights and for embedded ones; each stage alone, too."""
    from tests.conformance.avatars import AVATARS
    from tests.conformance.references import committed

    from avatar_runtime.conformance import conform

    for name in ("skin_polar", "surface_area", "surface_joints"):
        conform(AVATARS[name](), committed(name), "cpu")
    run(FIT)


def train() -> None:
    """What every system trains with."""
    run(TRAIN)


def run(tests: tuple[str, ...]) -> None:
    """Run tests of the trainer. `make test` judges them; here they only know how the kernels are called."""
    import pytest

    pytest.main(["--quiet", "--no-summary", *(f"tests/trainer/{test}" for test in tests)])


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
