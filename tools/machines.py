"""The numeric core as other machines compute it: `python -m tools.machines`, the end of `make test-more`.

Other processors: another kernel of the BLAS, NumPy without the instructions it chooses at start, Numba for a plain
processor. Other versions of Python: those of VERSIONS that are installed, each with mypy and an environment of its own
(.venv-3.12, ...), made at the first run. What is not there is named and left out.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERSIONS = tuple(v for v in ("3.11", "3.12", "3.13", "3.14") if v != "{}.{}".format(*sys.version_info))
X86 = ("x86_64", "AMD64")

# Where numbers are computed: the committed vectors, stages, backend `cpu`, readers against released codes, operations.
PLAYED = (
    "tests/conformance/test_conformance.py", "tests/runtime/stages", "tests/runtime/backends/test_cpu_animate.py",
    "tests/runtime/backends/test_cpu_draw_stages.py", "tests/runtime/backends/test_cpu_raster.py",
    "tests/runtime/test_engine_pose.py", "tests/runtime/test_handedness.py", "tests/runtime/test_pose.py",
    "tests/runtime/test_rotation.py", "tests/runtime/driving", "tests/exporter/asm", "tests/exporter/bodies",
    "tests/exporter/driving", "tests/exporter/ops", "tests/exporter/readers/test_gaussian_blendshapes.py",
    "tests/exporter/readers/test_surface_golden.py", "tests/exporter/readers/test_psavatar.py",
)  # fmt: skip
TRAINED = (
    "tests/samples/test_capture.py",
    "tests/trainer/kernels",
    "tests/trainer/raster",
    "tests/trainer/stages",
)
PACKAGES = ("avatar_schema", "avatar_shaders", "avatar_runtime", "avatar_export")  # without torch


def processors() -> dict[str, dict[str, str]]:
    """Name of a processor that this machine can act as -> the environment that does it."""
    if platform.machine() not in X86:
        return {}
    return {
        "BLAS of Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
        "BLAS of Zen": {"OPENBLAS_CORETYPE": "Zen"},
        "BLAS of Nehalem, NumPy and Numba of a plain x86": {
            "OPENBLAS_CORETYPE": "Nehalem",
            "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_features()),
            "NUMBA_CPU_NAME": "generic",
        },
    }


def numpy_features() -> list[str]:
    """The instructions that NumPy would choose at start on this processor."""
    # NumPy has no public list of what it chose; its own tests read this one, which its types do not know.
    from numpy._core._multiarray_umath import (  # type: ignore[attr-defined]
        __cpu_dispatch__,
        __cpu_features__,
    )

    return [name for name in __cpu_dispatch__ if __cpu_features__[name]]


def interpreter(version: str) -> str | None:
    """The program of a version of Python: on PATH, or one that pyenv installed."""
    found = [shutil.which(f"python{version}")]
    roots = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found += [str(path / "bin" / "python") for path in sorted(roots.glob(f"{version}.*"))]
    for program in filter(None, found):
        # One of pyenv's programs may be there for a version that is not chosen; it does not run.
        said = subprocess.run([program, "-c", "print(1)"], capture_output=True, text=True, check=False)
        if said.stdout.strip() == "1":
            return program
    return None


def environment(version: str, program: str) -> Path:
    """The Python of .venv-VERSION, which has what the tests need that do not train."""
    folder = ROOT / f".venv-{version}"
    python, done = folder / "bin" / "python", folder / "installed"
    if not done.exists() or done.stat().st_mtime < (ROOT / "pyproject.toml").stat().st_mtime:
        subprocess.run([program, "-m", "venv", str(folder)], check=True)
        for wanted in (["--upgrade", "pip>=25.1"], ["--editable", "."], ["--group", "test"]):
            subprocess.run([str(python), "-m", "pip", "install", "--quiet", *wanted], check=True, cwd=ROOT)
        done.touch()
    return python


def passed(python: Path, tests: Sequence[str], changed: Mapping[str, str], workers: str) -> bool:
    """Whether `tests` pass under `python` in a changed environment."""
    pytest = [str(python), "-m", "pytest", "--quiet"]
    command = [*pytest, "--numprocesses", workers, "--dist", "worksteal", *tests]
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **changed}, check=False).returncode == 0


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--workers", default="2", help="processes of pytest")
    parser.add_argument("--only", help="part of the name of what is to run: a processor, a version")
    given = parser.parse_args()
    results: dict[str, str] = {}

    def wanted(name: str) -> bool:
        return given.only is None or given.only in name

    for name, changed in processors().items():
        if wanted(name):
            print(f"== {name}", flush=True)
            good = passed(Path(sys.executable), (*PLAYED, *TRAINED), changed, given.workers)
            results[name] = "passed" if good else "FAILED"
    if not processors():
        results["other processors"] = f"left out: no table of kernels for {platform.machine()}"
    for version in filter(wanted, VERSIONS):
        name, program = f"Python {version}", interpreter(version)
        if program is None:
            results[name] = "left out: not installed"
            continue
        print(f"== {name}", flush=True)
        python = environment(version, program)
        flags = [flag for package in PACKAGES for flag in ("-p", package)]
        typed = subprocess.run([str(python), "-m", "mypy", *flags], cwd=ROOT, check=False).returncode == 0
        good = passed(python, PLAYED, {}, given.workers)
        verdict = "passed" if good and typed else "FAILED"
        results[name] = f"{verdict}; the trainer's tests are left out, since torch is not installed for it"
    for name, result in results.items():
        print(f"{name}: {result}")
    return any(result.startswith("FAILED") for result in results.values())


if __name__ == "__main__":
    sys.exit(main())
