"""Kills training by signal 9 at random moments and holds what comes out against a run that nobody disturbed.

`python -m tests.trainer.kill --times 20` on the toy system, whose checkpoints carry ballast so that writing them takes
most of the time; `--capture DIR --system gaussian_blendshapes -- --iterations 60` on a real one.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avatar_trainer import checkpoint, run
from tests.trainer import toy

ROOT = Path(__file__).parents[2]
PATIENCE = 300.0  # seconds for a process to come to its next checkpoint
PAUSE = 0.002
LATER = 0.06  # seconds: the longest wait between a checkpoint and the signal


@dataclass(frozen=True)
class Report:
    """What came of a trial."""

    kills: int
    while_writing: int  # kills that left a file half written
    restarts_from_nothing: int  # kills before the first checkpoint


def trial(arguments: Sequence[str], folder: Path, times: int, seed: int, iterations: int) -> Report:
    """Run avatar-train with `arguments` twice, once killed `times` times.

    Raises AssertionError where a checkpoint is broken after a kill, or the two runs end in different bytes.
    """
    whole, cut = folder / "whole", folder / "cut"
    finish(arguments, whole)
    rng = np.random.default_rng(seed)
    report = Report(0, 0, 0)
    for target in sorted(rng.integers(0, max(iterations * 3 // 4, 1), times).tolist()):
        report = killed(arguments, cut, target, float(rng.uniform(0, LATER)), report)
    finish(arguments, cut)
    assert contents(whole / run.CHECKPOINTS, last=True) == contents(cut / run.CHECKPOINTS, last=True)
    assert contents(whole / run.UPSTREAM) == contents(cut / run.UPSTREAM)
    assert not checkpoint.partials(cut / run.CHECKPOINTS)
    return report


def killed(arguments: Sequence[str], out: Path, target: int, later: float, report: Report) -> Report:
    """One process, killed `later` seconds after its checkpoints came to iteration `target`."""
    folder = out / run.CHECKPOINTS
    before = newest(folder)
    process = subprocess.Popen(command(arguments, out), cwd=ROOT, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + PATIENCE
    while newest(folder) < target and process.poll() is None and time.monotonic() < deadline:
        time.sleep(PAUSE)
    time.sleep(later)
    process.send_signal(signal.SIGKILL)  # nothing where it has ended by itself
    _, said = process.communicate()
    if process.returncode == 0:
        return report
    assert process.returncode == -signal.SIGKILL, f"ended by itself with {process.returncode}: {said[-2000:]}"
    found = checkpoint.newest(folder, _broken)
    assert (0 if found is None else found.iteration) >= before
    return Report(
        report.kills + 1,
        report.while_writing + bool(checkpoint.partials(folder)),
        report.restarts_from_nothing + (found is None),
    )


def _broken(text: str) -> None:
    raise AssertionError(f"a broken checkpoint after a kill: {text}")


def newest(folder: Path) -> int:
    """The iteration of the newest checkpoint file."""
    return max((int(path.stem[10:]) for path in checkpoint.paths(folder)), default=0)


def finish(arguments: Sequence[str], out: Path) -> None:
    """Let a run come to its end."""
    done = subprocess.run(command(arguments, out), cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


def command(arguments: Sequence[str], out: Path) -> list[str]:
    return [sys.executable, "-m", "tests.trainer.toy", *arguments, "--out", str(out)]


def contents(folder: Path, last: bool = False) -> dict[str, bytes]:
    """The files of a folder, or the newest checkpoint alone."""
    paths = checkpoint.paths(folder)[-1:] if last else sorted(p for p in folder.rglob("*") if p.is_file())
    assert paths, folder
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--system", default="toy")
    parser.add_argument("--capture", type=Path)
    parser.add_argument("--iterations", type=int, default=120)
    parser.add_argument("rest", nargs="*", help="more options of avatar-train, after --")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        capture = given.capture or toy.capture_folder(folder / "capture")
        ballast = ["--set", f"ballast={32 << 20}"] if given.system == "toy" else []
        every = ["--iterations", str(given.iterations), "--checkpoint-every", "1"]
        arguments = [given.system, str(capture.resolve()), *every, *ballast, *given.rest]
        began = time.monotonic()
        report = trial(arguments, folder, given.times, given.seed, given.iterations)
    print(
        f"{report.kills} kills in {time.monotonic() - began:.0f} s: {report.while_writing} while a checkpoint was "
        f"being written, {report.restarts_from_nothing} before the first; no broken checkpoint; same bytes as "
        "undisturbed"
    )


if __name__ == "__main__":
    main()
