"""Kills training by signal 9 at random moments and compares the result with an undisturbed run.

`python -m tests.trainer.loop.kill --times 20` on the toy system, whose checkpoints carry ballast so that writing them
takes most of the time; `--capture DIR --system gaussian_blendshapes -- --iterations 60` on a real one.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np

from avatar_trainer.loop import checkpoint, run
from tests.trainer import toy

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
    process, said = started(arguments, out)
    deadline = time.monotonic() + PATIENCE
    while newest(folder) < target and process.is_alive() and time.monotonic() < deadline:
        time.sleep(PAUSE)
    time.sleep(later)
    process.kill()  # nothing where it has ended by itself
    process.join()
    if process.exitcode == 0:
        return report
    assert process.exitcode == -signal.SIGKILL, f"ended by itself with {process.exitcode}: {end_of(said)}"
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
    process, said = started(arguments, out)
    process.join()
    assert process.exitcode == 0, end_of(said)


def started(arguments: Sequence[str], out: Path) -> tuple[BaseProcess, Path]:
    """A process of avatar-train, and the file that has what it says.

    It is forked from a server that has imported what training needs, so that it starts in a moment.
    """
    context = get_context("forkserver")
    context.set_forkserver_preload([toy.__name__])
    said = out.with_suffix(".log")
    process = context.Process(target=train, args=([*arguments, "--out", str(out)], said))
    process.start()
    return process, said


def train(arguments: list[str], said: Path) -> None:
    """The command, in a process of its own."""
    with said.open("ab", buffering=0) as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    sys.argv = ["avatar-train", *arguments]
    toy.main()


def end_of(said: Path) -> str:
    """What a process said last."""
    return said.read_text("utf-8", errors="replace")[-2000:]


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
